/* SPDX-License-Identifier: MIT */
/* ekf.c - NAME_filter_tick, a Kalman filter on the learned model: q and qd of the chain from noisy joint angles alone; beside it
   NAME_observer_tick, an observer with steady gains.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/ekf.c -o ekf -lm

   With -DMS=1 ticks are 1 ms apart, not 5.
   The plant is the true chain of chain_plant.h: the model has seen other recordings of it, the filter none. 20 runs of 5 s.
   No force acts; under a known one give chain_filter_tick its torque, in the model's own unit (see control_tick.c). */

#include <stdio.h>
#include "chain.h"
#include "chain_plant.h"
#include "chain_weights.h"

/* The same model, whose filter looks ahead by one evaluation of it, for microcontrollers. */
#define ROLN_NAME    brief
#define ROLN_AE      8, 2
#define ROLN_CHART   polynomial, 3
#define ROLN_MLP     16, 16
#define ROLN_FILTER  leapfrog
#include "roln.h"

enum { N = chain_N, n = chain_n, n2 = 2 * n };
#ifndef MS
#define MS 5 /* ms from tick to tick */
#endif
#define TICK (ROLN_C(0.001) * MS) /* s */
#define NOISE ROLN_C(0.02) /* rad, of each encoder, Gaussian */

/* ---- 1 what runs in the controller ------------------------------------------------------------ */

/* A joint further than 6 deviations from where it is expected is not used; after 5 such ticks in a row the filter starts again. */
static roln_noise noise = {.dt = TICK, .q = NOISE, .gate = 6, .lost = 5}; /* and tau, from recordings: below */
static chain_filter filter;                                              /* zeroed: it starts with the first measurement */
static chain_filter_tick_work filterwork;
static chain_work work;

/* One tick: angles y in (NaN: none), q and qd out. Nonzero if there is no estimate. */
static int tick(const roln_real y[N], chain_state *x)
{
    return (chain_filter_tick(&chain_weights, &noise, y, NULL, &filter, &filterwork) & ROLN_FILTER_NONE) ||
           chain_decode(&chain_weights, &filter.s, x, &work.decode) != ROLN_OK;
}

/* ---- 2 the experiment ------------------------------------------------------------------------- */

enum { RUNS = 20, TUNE = 5, TICKS = 5000 / MS, SETTLED = 500 / MS, COUNT = TICKS - SETTLED }; /* errors count after 0.5 s */
static chain_state truth[RUNS][TICKS + 1];
static roln_real y[RUNS][TICKS + 1][N];

/* Runs of the true chain from anywhere, as in the training, and what the encoders say. */
static void simulate(int runs, uint64_t *seed)
{
    for (int r = 0; r < runs; r++) {
        motion s;
        for (int i = 0; i < 2; i++) {
            s.z[i] = 1.4 * (double)roln_uniform(seed) - 0.7;
            s.zd[i] = 2 * (double)roln_uniform(seed) - 1;
        }
        for (int k = 0; k <= TICKS; k++) {
            const pose p = pose_of(&s);
            for (int i = 0; i < N; i++) {
                truth[r][k].q[i] = (roln_real)(p.a[i] - (i > 0 ? p.a[i - 1] : 0));
                truth[r][k].qd[i] = (roln_real)(p.ad[i] - (i > 0 ? p.ad[i - 1] : 0));
                y[r][k][i] = truth[r][k].q[i] + NOISE * roln_normal(seed);
            }
            for (int i = 0; i < MS; i++)
                advance(&s, (double)TICK / MS);
        }
    }
}

typedef struct { double q, qd; } error; /* sums of squares, at last rms over all joints, settled ticks, runs */

static void compare(const roln_real *q, const roln_real *qd, const chain_state *x, error *e)
{
    for (int i = 0; i < N; i++) {
        const double d = (double)(q[i] - x->q[i]), dd = (double)(qd[i] - x->qd[i]);
        e->q += d * d;
        e->qd += dd * dd;
    }
}

static error rms(error e, int count)
{
    e.q = sqrt(e.q / count / N);
    e.qd = sqrt(e.qd / count / N);
    return e;
}

/* Measured angles and their central differences, which look one tick ahead. */
static error raw(void)
{
    error e = {0, 0};
    for (int r = 0; r < RUNS; r++)
        for (int k = SETTLED; k < TICKS; k++) {
            roln_real qd[N];
            for (int i = 0; i < N; i++)
                qd[i] = (y[r][k + 1][i] - y[r][k - 1][i]) / (2 * TICK);
            compare(y[r][k], qd, &truth[r][k], &e);
        }
    return rms(e, RUNS * COUNT);
}

/* Critically damped alpha-beta (gamma = 0) or alpha-beta-gamma filter of each joint, with poles at p. */
static error tracker(int order, double p)
{
    const double a = order == 2 ? 1 - p * p : 1 - p * p * p, b = (order == 2 ? 1 : 1.5 * (1 + p)) * (1 - p) * (1 - p);
    const roln_real alpha = (roln_real)a, beta = (roln_real)b / TICK, T = TICK;
    const roln_real gamma = order == 2 ? 0 : (roln_real)((1 - p) * (1 - p) * (1 - p)) / (T * T);
    error e = {0, 0};
    for (int r = 0; r < RUNS; r++) {
        roln_real q[N], qd[N] = {0}, qdd[N] = {0};
        memcpy(q, y[r][0], sizeof q);
        for (int k = 1; k < TICKS; k++) {
            for (int i = 0; i < N; i++) {
                const roln_real ahead = q[i] + T * qd[i] + T * T / 2 * qdd[i], d = y[r][k][i] - ahead;
                q[i] = ahead + alpha * d;
                qd[i] += T * qdd[i] + beta * d;
                qdd[i] += gamma * d;
            }
            if (k >= SETTLED) compare(q, qd, &truth[r][k], &e);
        }
    }
    return rms(e, RUNS * COUNT);
}

/* The best that it can do: poles chosen with hindsight, for q and for qd each on its own, among 0.5 .. 0.995. */
static error best_tracker(int order)
{
    error best = {HUGE_VAL, HUGE_VAL};
    for (int i = 0; i < 100; i++) {
        const error e = tracker(order, 0.5 + 0.005 * i);
        best.q = fmin(best.q, e.q);
        best.qd = fmin(best.qd, e.qd);
    }
    return best;
}

/* Sums over runs and settled ticks. */
typedef struct {
    int runs;
    error e, soon;    /* soon: after 0.1 s */
    double nis, nees; /* normalised innovation and estimation error squared: N (working encoders) and 2n expected */
    double inside;    /* ticks at which the true (z, zd) lies in the ellipsoid of P that should hold 95 % */
} score;

static void add(score *to, const score *s)
{
    to->runs += s->runs;
    to->e.q += s->e.q, to->e.qd += s->e.qd, to->soon.q += s->soon.q, to->soon.qd += s->soon.qd;
    to->nis += s->nis, to->nees += s->nees, to->inside += s->inside;
}

/* d^T P^-1 d of the error d of the estimate, P = F^T F; negative if P is not positive definite. */
static double squared(const chain_latent *s)
{
    roln_real d[n2], P[n2 * n2] = {0}, L[n2 * n2];
    roln_mm_at(n2, n2, n2, filter.F, filter.F, P);
    if (roln_chol(n2, P, L) != ROLN_OK) return -1;
    for (int i = 0; i < n; i++) {
        d[i] = filter.s.z[i] - s->z[i];
        d[n + i] = filter.s.zd[i] - s->zd[i];
    }
    roln_solve_lower(n2, L, d, d);
    return (double)roln_dot(n2, d, d);
}

/* The filter on run r, with the first `broken` encoders silent after the start. Adds to a if the chain never leaves the range
   seen in training, else to b. Nonzero: something failed. */
static int run(int r, int broken, score *a, score *b)
{
    score c = {.runs = 1}, *to = a;
    memset(&filter, 0, sizeof filter);
    for (int k = 0; k < TICKS; k++) {
        chain_latent s;
        chain_state x;
        roln_real in[N];
        double nees;
        for (int i = 0; i < N; i++)
            in[i] = k > 0 && i < broken ? (roln_real)NAN : y[r][k][i];
        if (tick(in, &x)) return 1;
        if (chain_encode(&chain_weights, &truth[r][k], &s, &work.encode) != ROLN_OK) return 1; /* the true (z, zd) */
        if (!chain_in_range(&chain_weights, &s)) to = b;
        if (k == 100 / MS) compare(x.q, x.qd, &truth[r][k], &c.soon);
        if (k < SETTLED) continue;
        compare(x.q, x.qd, &truth[r][k], &c.e);
        if ((nees = squared(&s)) < 0) return 1;
        c.nis += (double)filter.f.nis;
        c.nees += nees;
        c.inside += nees < 9.488; /* chi-square, 4 degrees */
    }
    add(to, &c);
    return filter.f.starts != 1;
}

/* Errors of a cheaper estimate: of the filter by leapfrog; with gains of the observer. HUGE_VAL: something failed. */
static error cheaper(const brief_params *p, const brief_observer_gains *gains)
{
    static brief_filter_tick_work of_filter;
    static brief_observer_tick_work of_observer;
    error e = {0, 0};
    const error failed = {HUGE_VAL, HUGE_VAL};
    for (int r = 0; r < RUNS; r++) {
        static brief_filter f;
        brief_observer o;
        memset(&f, 0, sizeof f), memset(&o, 0, sizeof o);
        for (int k = 0; k < TICKS; k++) {
            chain_latent s;
            chain_state x;
            if (gains) brief_observer_tick(p, gains, y[r][k], NULL, &o, &of_observer);
            else brief_filter_tick(p, &noise, y[r][k], NULL, &f, &of_filter);
            memcpy(&s, gains ? &o.s : &f.s, sizeof s);
            if (!(gains ? o.f.valid : f.f.valid) || chain_decode(&chain_weights, &s, &x, &work.decode) != ROLN_OK) return failed;
            if (k >= SETTLED) compare(x.q, x.qd, &truth[r][k], &e);
        }
    }
    return rms(e, RUNS * COUNT);
}

static void print(const char *name, error e, const char *end)
{
    printf("%-40s %8.2f %9.3f%s", name, 1000 * e.q, e.qd, end);
}

static void print_score(const char *name, const score *s)
{
    const double count = s->runs * COUNT;
    if (s->runs == 0) return;
    print(name, rms(s->e, s->runs * COUNT), "");
    printf("%9.3f %7.2f %9.1f %%\n", s->nis / count, s->nees / count, 100 * s->inside / count);
}

int main(void)
{
    static score in, out, total, broken;
    static chain_train train; /* on a PC: its numbers go into the controller */
    static brief_params brief;
    static brief_observer_gains gains;
    static brief_train brief_train_work;
    static unsigned char bytes[chain_packed_size];
    const roln_batch recordings = {TUNE, TICKS, 1, NULL, y[0][0], NULL, NULL, NULL};
    char name[64];
    uint64_t seed = 2026;
    printf("flash: weights %u bytes    RAM: filter %u bytes, scratch %u\n", (unsigned)sizeof chain_weights, (unsigned)sizeof filter,
           (unsigned)(sizeof work > sizeof filterwork ? sizeof work : sizeof filterwork));

    /* how far the model is off, from measurements alone, as on a real machine */
    simulate(TUNE, &seed);
    if (chain_fit_noise(&chain_weights, &recordings, &noise, NULL, NULL, &train.fit_noise) != ROLN_OK) return 1;
    chain_pack(&chain_weights, bytes);
    if (brief_unpack(sizeof bytes, bytes, &brief) != ROLN_OK ||
        brief_fit_observer(&brief, &noise, &recordings, &gains, &brief_train_work.fit_observer) != ROLN_OK)
        return 1;
    printf("error of the model as a torque: %.3g of its unit, from %d other runs\n\n", (double)noise.tau, TUNE);

    simulate(RUNS, &seed);
    for (int r = 0; r < RUNS; r++)
        if (run(r, 0, &in, &out) || run(r, 3, &broken, &broken)) return 1;
    total = in;
    add(&total, &out);
    printf("%2d runs of the true chain, rms errors      q, mrad qd, rad/s      NIS    NEES  within 95 %%\n", RUNS);
    print("measured, central differences", raw(), "\n");
    print("alpha-beta per joint, best poles", best_tracker(2), "\n");
    print("alpha-beta-gamma per joint, best poles", best_tracker(3), "\n");
    print_score("EKF on the learned model", &total);
    snprintf(name, sizeof name, "  %d runs in the range of the training", in.runs);
    print_score(name, &in);
    snprintf(name, sizeof name, "  %d runs that leave it", out.runs);
    print_score(name, &out);
    print_score("EKF, 3 of 8 encoders broken", &broken);
    print("EKF, ROLN_FILTER leapfrog", cheaper(&brief, NULL), "\n");
    print("observer, steady gains", cheaper(&brief, &gains), "\n");
    printf("\nexpected if consistent: NIS 8 +- %.2f (95 %%, all runs; 5 with 3 encoders broken), NEES 4, 95 %% within\n"
           "the filter starts at rest, the chain does not: after 0.1 s qd is off by %.3f rad/s\n",
           1.96 * sqrt(2.0 * N / (RUNS * COUNT)), rms(total.soon, RUNS).qd);
    return 0;
}
