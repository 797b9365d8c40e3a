/* SPDX-License-Identifier: MIT */
/* longest.c - firmware.c with WORST: of a tick, a step and a tick of the filter the most instructions over STATES random states in
   the range seen in training, as they come, and along the longest way (firmware.c: longest). That of the filter: it loses its
   estimate and starts anew in the same tick. Lines: what, seen, worst. */

#include "text.h"
#include "states.h"

/* Most instructions of f so far, as it comes and along the longest way. */
static void longer(uint32_t most[2], roln_status (*f)(void), void (*again)(void))
{
    for (int way = 0; way < 2; way++) {
        again();
        const uint32_t empty = count(nothing);
        longest_way = way * (f == observe ? 2 : 1);
        const uint32_t used = count(f) - empty;
        longest_way = 0;
        if (used > most[way]) most[way] = used;
    }
}

static void go_on(void)
{
}

/* The filter follows, under no torque. */
static void follow(void)
{
    const roln_noise noise = {.dt = 0.001f, .q = 1e-3f, .tau = 0.1f, .gate = 5, .lost = 3};
    memset(&observer.filter, 0, sizeof observer.filter);
    observer.noise = noise;
    memset(control.guard.tau, 0, sizeof control.guard.tau);
    memcpy(observer.y, control.x.q, sizeof observer.y);
    must(observe()), must(observe());
    if (observer.filter.f.starts != 1) give_up("no filter\n");
}

/* Its next measurement is believed, and out of range. */
static void lose(void)
{
    follow();
    observer.noise.gate = 0;
    for (int i = 0; i < N; i++)
        observer.y[i] += i % 2 ? 1e5f : -1e5f;
}

int main(void)
{
    uint32_t most[4][2] = {{0}};
    for (int k = 0; k < STATES; k++) {
        setup(NULL), longer(most[0], tick, go_on);
        setup(NULL), longer(most[1], ahead, go_on);
        setup(NULL), longer(most[2], observe, follow);
        longer(most[3], observe, lose);
        if (observer.filter.f.starts != 2) give_up("a filter that was not lost\n");
    }
    print("tick", most[0][0], most[0][1]), print("ahead", most[1][0], most[1][1]), print("filter", most[2][0], most[3][1]);
    return 0;
}
