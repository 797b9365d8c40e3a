/* SPDX-License-Identifier: MIT */
/* chart.c - a machine finds its coordinates by itself: the chart of a soft arm, eight joints on three tendons, in closed form from
   a stream of encoder readings.

   The arm is simulated: tendons pull it to and fro, the further a joint is bent the stiffer it is, and every other one bends more
   easily. First the POD of a few samples, which makes the linear encoder; they must go as far as the machine will. From then on
   every sample is added to the sums of the decoder and forgotten. The decoder may be solved for at any time, and the sums go on.
   Samples that do not fill the coordinates yet are refused, and the chart stays as it is. Sums are in double, here in software:
   they have the same bits on every core and on the PC, and so has the chart.

   Prints the error of the chart on motion that it has not seen, relative to that motion, at first that of the linear one, and a
   hash of all that was learned. */

#define ROLN_NAME  arm
#define ROLN_AE    8, 3
#define ROLN_CHART polynomial, 3
#define ROLN_MLP   16 /* networks, for later */
#include "roln.h"
#include "text.h"

enum {
    N = arm_N, n = arm_n,
    FIRST = 200, EVERY = 4, /* samples for the POD, ticks between them */
    SAMPLES = 4000, TESTS = 500
};
#define TICK 0.05f /* s */

/* Three tendons, each pulled to and fro, and let go somewhere. */
typedef struct { float pull[n], rate[n]; } tendons;

static void let_go(tendons *t, uint64_t *seed)
{
    for (int i = 0; i < n; i++) {
        t->pull[i] = 0.2f + 0.1f * roln_uniform(seed);
        t->rate[i] = roln_uniform(seed);
    }
}

/* The joints q a tick later, qd. */
static void measure(tendons *t, arm_state *x)
{
    for (int i = 0; i < n; i++) {
        t->rate[i] -= TICK * (3 + 2.3f * (float)i) * t->pull[i];
        t->pull[i] += TICK * t->rate[i];
    }
    for (int k = 0; k < N; k++) {
        const float u = (2 * (float)k + 1) / N - 1; /* along the arm, -1 .. 1 */
        const float bend = t->pull[0] + u * t->pull[1] + (1.5f * u * u - 0.5f) * t->pull[2];
        const float q = bend / ROLN_SQRT(1 + bend * bend / 4) + (k % 2 ? 0.2f : -0.2f) * bend * bend;
        x->qd[k] = (q - x->q[k]) / TICK;
        x->q[k] = q;
    }
}

static struct {
    arm_params model;
    arm_chart sums;
    float q[FIRST][N], qd[FIRST][N]; /* for the POD alone */
    union {
        arm_start start;
        arm_work work;
    } u;
} ram;

/* sqrt(sum |phi(rho(q)) - q|^2 / sum |q|^2) over motion that is not learned from. */
static float test(void)
{
    uint64_t seed = 99;
    float error = 0, size = 0;
    tendons t;
    arm_state x = {{0}, {0}}, y;
    arm_latent s;
    let_go(&t, &seed);
    for (int k = 0; k < TESTS; k++) {
        measure(&t, &x);
        if (arm_encode(&ram.model, &x, &s, &ram.u.work.encode) != ROLN_OK ||
            arm_decode(&ram.model, &s, &y, &ram.u.work.decode) != ROLN_OK)
            return -1;
        for (int i = 0; i < N; i++) {
            error += (y.q[i] - x.q[i]) * (y.q[i] - x.q[i]);
            size += x.q[i] * x.q[i];
        }
    }
    return ROLN_SQRT(error / size);
}

/* The linear encoder, and as many coordinates as there are tendons. */
static roln_status start(tendons *t, uint64_t *seed)
{
    arm_state x = {{0}, {0}};
    float mean[N];
    measure(t, &x); /* two positions make a velocity */
    for (int k = 0; k < FIRST * EVERY; k++) {
        measure(t, &x);
        memcpy(ram.q[k / EVERY], x.q, sizeof x.q); /* the last one stays */
        memcpy(ram.qd[k / EVERY], x.qd, sizeof x.qd);
    }
    return arm_init_pod(&ram.model, FIRST, ram.q[0], ram.qd[0], mean, seed, &ram.u.start.init_pod);
}

static void report(uint32_t samples, roln_status st)
{
    put_integer(samples, 7);
    put_real(test(), 5);
    put_text(st == ROLN_OK ? "\n" : "  refused\n");
}

int main(void)
{
    uint64_t seed = 1, hash = ROLN_FNV;
    uint32_t most = 0, solve = 0;
    tendons t;
    arm_state x = {{0}, {0}};
    let_go(&t, &seed);
    if (start(&t, &seed) != ROLN_OK) return 1;
    put_text("samples        error\n");
    report(0, ROLN_OK);
    for (uint32_t k = 1, next = 40; k <= SAMPLES; k++) {
        measure(&t, &x);
        const uint32_t before = board_count();
        if (arm_chart_add(&ram.model, 1, x.q, &ram.sums, &ram.u.start.chart_add) != ROLN_OK) return 1;
        const uint32_t used = board_count() - before;
        if (used > most) most = used;
        if (k == next) {
            float left; /* of the samples */
            const uint32_t count = board_count();
            const roln_status st = arm_chart_solve(&ram.model, &ram.sums, 0, &left, &ram.u.start.chart_solve);
            solve = board_count() - count;
            report(k, st);
            next *= 10;
        }
    }
    hash = roln_fnv((int)sizeof ram.sums, (const unsigned char *)&ram.sums, hash);
    hash = roln_fnv((int)sizeof ram.model, (const unsigned char *)&ram.model, hash);
    put_text("bytes of RAM: model ");
    put_integer(sizeof ram.model, 0);
    put_text(", sums ");
    put_integer(sizeof ram.sums, 0);
    put_text(", scratch ");
    put_integer(sizeof ram.u, 0);
    put_text(", samples for the POD ");
    put_integer(sizeof ram.q + sizeof ram.qd, 0);
    put_text("\nhash ");
    put_hex(hash, 16);
    put_text("\ninstructions of a sample ");
    put_integer(most, 0);
    put_text(", of a solve ");
    put_integer(solve, 0);
    put_text("\n");
    return 0;
}
