/* SPDX-License-Identifier: MIT */
/* longest.c - firmware.c with WORST: of a tick, a step, a tick of the filter, one of the observer and a doubt the most
   instructions over STATES random states in the range seen in training, as they come, and along the longest way (longest_way.h).
   That of the filter and of the observer: they lose their estimate and start anew in the same tick. Lines: what, seen, worst. */

#include "text.h"
#include "states.h"

/* Most instructions of f so far, as it comes and along the longest way. */
static void longer(uint32_t most[2], roln_status (*f)(void), void (*again)(void))
{
    for (int way = 0; way < 2; way++) {
        again();
        const uint32_t empty = count(nothing);
        longest_way = way * (f == filter ? 2 : 1);
        const uint32_t used = count(f) - empty;
        longest_way = 0;
        if (used > most[way]) most[way] = used;
    }
}

static void go_on(void)
{
}

/* Filter and observer follow, under no torque. */
static void follow(void)
{
    struct estimates *e = &estimates;
    const roln_noise noise = {.dt = 0.001f, .q = 1e-3f, .tau = 0.1f, .gate = 5, .lost = 3};
    memset(&e->filter, 0, sizeof e->filter), memset(&e->observer, 0, sizeof e->observer), memset(&e->gains, 0, sizeof e->gains);
    e->noise = noise;
    e->gains.dt = noise.dt, e->gains.gate = 0, e->gains.lost = noise.lost;
    for (int i = 0; i < N; i++)
        e->gains.q[i] = noise.q, e->gains.e[i] = 2 * noise.q;
    memset(control.guard.tau, 0, sizeof control.guard.tau);
    memcpy(e->y, control.x.q, sizeof e->y);
    must(filter()), must(filter()), must(observe()), must(observe());
    if (e->filter.f.starts != 1 || e->observer.f.starts != 1) give_up("no estimate\n");
}

/* Their next measurement is believed, and out of range. */
static void lose(void)
{
    follow();
    estimates.noise.gate = 0;
    for (int c = 0; c < M(centres); c++)
        estimates.gains.P[0][c][0] = estimates.gains.P[1][c][0] = 1e3f;
    for (int i = 0; i < N; i++)
        estimates.y[i] += i % 2 ? 1e5f : -1e5f;
}

/* Evidence of one state, L = I. */
static void know(void)
{
    int i;
    memset(&estimates.known, 0, sizeof estimates.known);
    estimates.known.count = 1;
    for (i = 0; i < M(terms); i++)
        estimates.known.L[ROLN_TRI(i) + i] = 1;
}

int main(void)
{
    uint32_t most[7][2] = {{0}};
    for (int k = 0; k < STATES; k++) {
        setup(NULL), longer(most[0], tick, know);
        setup(NULL), longer(most[1], ahead, go_on);
        setup(NULL), longer(most[2], filter, follow);
        longer(most[3], filter, lose);
        if (estimates.filter.f.starts != 2) give_up("a filter that was not lost\n");
        setup(NULL), longer(most[4], observe, follow);
        longer(most[5], observe, lose);
        if (estimates.observer.f.starts != 2) give_up("an observer that was not lost\n");
        setup(NULL), longer(most[6], doubt, know);
    }
    print("tick", most[0][0], most[0][1]), print("ahead", most[1][0], most[1][1]), print("filter", most[2][0], most[3][1]);
    print("observer", most[4][0], most[5][1]), print("doubt", most[6][0], most[6][1]);
    return 0;
}
