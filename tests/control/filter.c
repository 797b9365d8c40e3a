/* SPDX-License-Identifier: MIT */
/* filter - NAME_filter_tick and NAME_observer_tick against the best filter of each joint on three chains of rods, through 12-bit
   encoders of which every 20th sample is dropped: 20 runs of 5 s each, in ticks of 5 ms. The machines are what their models were
   trained on, in closed form and in double; their torques, where there are any, are held over a tick and known to both.
     filter [DIRECTORY of pend2_act.roln and pend16_act.roln]        tests/mujoco/models */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/chain_plant.h"
#include "examples/chain_weights.h"
#include "examples/pend16.h"
#include "examples/pend2.h"

enum { RUNS = 20, TUNE = 2, TICKS = 1000, SETTLED = 100, MAXN = 16, MAXn = 4, FREE = 4 }; /* errors count after 0.5 s */
#define TICK 0.005
#define STEP (6.283185307179586 / 4096) /* of an encoder, rad */
#define PI 3.141592653589793

/* ---- 1 machines ------------------------------------------------------------------------------- */

/* N rods hanging from the origin. Joint i follows joint i - i % span as q = c_0 z + c_1 z^2 + c_2 z^3 + c_3 z^4 of its angle z; the
   first of each span is free, and has a motor if there are sines. */
typedef struct {
    const char *name;
    int N, n;
    double length, mass;
    double follow[MAXN][4];
    double start, speed;     /* largest angle and rate of a free joint at the start */
    int sines;               /* of each motor; 0: none */
    double low[MAXn], high[MAXn]; /* of the torque of a motor, Nm */
    double fast;             /* largest frequency, Hz */
} machine;

static const machine machines[] = {
    {"chain: 8 joints, 2 coordinates", 8, 2, ROD, MASS,
     {{1}, {.2, .5}, {-.2, -.5, .2}, {-.3, .4, -.2}, {1}, {.2, -.5}, {-.4, .4, .2}, {-.2, .5, -.2}},
     .7, 1, 0, {0}, {0}, 0},
    {"pend2: 2 joints, driven", 2, 2, 1, 1, {{1}, {1}}, .8, 0, 1, {1, .3}, {4, 1}, 2},
    {"pend16: 16 joints, 4 coordinates, driven", 16, 4, .125, .125,
     {{1}, {.8, .4025}, {-.65, .175, .255}, {.255, -.45, 0, .156},
      {1}, {.56, .2975}, {-.5, .2875, .39}, {.39, -.315, 0, .12},
      {1}, {.92, .455}, {-.35, .2125, .3}, {.3, -.5175, 0, .084},
      {1}, {.68, .35}, {-.575, .325, .21}, {.21, -.3825, 0, .138}},
     .3, 0, 3, {.1962, .11036, .04905, .01226}, {.3924, .22073, .0981, .02453}, 3},
};

typedef struct { double z[MAXn], zd[MAXn]; } state;

/* Joints q, qd, their derivatives J by the free ones, and (dJ/dt) zd. */
typedef struct { double q[MAXN], qd[MAXN], J[MAXN], Jdzd[MAXN]; } joints;

static joints joints_of(const machine *p, const state *s)
{
    joints x;
    for (int i = 0; i < p->N; i++) {
        const int j = i / (p->N / p->n);
        const double *c = p->follow[i], z = s->z[j], zd = s->zd[j];
        x.q[i] = z * (c[0] + z * (c[1] + z * (c[2] + z * c[3])));
        x.J[i] = c[0] + z * (2 * c[1] + z * (3 * c[2] + z * 4 * c[3]));
        x.qd[i] = x.J[i] * zd;
        x.Jdzd[i] = (2 * c[1] + z * (6 * c[2] + z * 12 * c[3])) * zd * zd;
    }
    return x;
}

/* zdd from (J^T M J) zdd = J^T (tau - bias - M (dJ/dt) zd) of the angles of the rods with the vertical, a_i = q_0 + .. + q_i:
   M_ij = m_ij cos(a_i - a_j), bias_i = sum_j m_ij sin(a_i - a_j) ad_j^2 + weight_i sin a_i. tau [n]: of the free joints. */
static void accelerate(const machine *p, const state *s, const double *tau, double *zdd)
{
    const joints x = joints_of(p, s);
    const double ml2 = p->mass * p->length * p->length;
    double a[MAXN], ad[MAXN], add[MAXN], J[MAXN][MAXn], A[MAXn][MAXn + 1] = {{0}};
    for (int i = 0; i < p->N; i++) {
        a[i] = x.q[i], ad[i] = x.qd[i], add[i] = x.Jdzd[i];
        for (int j = 0; j < p->n; j++)
            J[i][j] = j == i / (p->N / p->n) ? x.J[i] : 0;
        if (i == 0) continue;
        a[i] += a[i - 1], ad[i] += ad[i - 1], add[i] += add[i - 1];
        for (int j = 0; j < p->n; j++)
            J[i][j] += J[i - 1][j];
    }
    for (int i = 0; i < p->N; i++) {
        double moment = -p->mass * GRAVITY * p->length * (p->N - 1 - i + .5) * sin(a[i]), MJ[MAXn] = {0};
        for (int k = 0; k < p->N; k++) {
            const double m = ml2 * (p->N - 1 - (i > k ? i : k) + (i == k ? 1. / 3 : .5)), M = m * cos(a[i] - a[k]);
            moment -= m * sin(a[i] - a[k]) * ad[k] * ad[k] + M * add[k];
            for (int j = 0; j < p->n; j++)
                MJ[j] += M * J[k][j];
        }
        for (int j = 0; j < p->n; j++) {
            for (int k = 0; k < p->n; k++)
                A[j][k] += J[i][j] * MJ[k];
            A[j][p->n] += J[i][j] * moment;
        }
    }
    for (int j = 0; j < p->n; j++) /* a motor at a free joint does work on its z alone */
        A[j][p->n] += tau[j];
    for (int k = 0; k < p->n; k++)
        for (int i = 0; i < p->n; i++)
            for (int j = p->n; j >= k && i != k; j--)
                A[i][j] -= A[i][k] / A[k][k] * A[k][j];
    for (int j = 0; j < p->n; j++)
        zdd[j] = A[j][p->n] / A[j][j];
}

/* One step of the classical Runge-Kutta scheme. */
static void step(const machine *p, const double *tau, double h, state *s)
{
    static const double at[4] = {0, .5, .5, 1}, part[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const state start = *s;
    double zd[MAXn] = {0}, zdd[MAXn] = {0};
    for (int k = 0; k < 4; k++) {
        state x = start;
        for (int i = 0; i < p->n; i++)
            x.z[i] += at[k] * h * zd[i], x.zd[i] += at[k] * h * zdd[i];
        accelerate(p, &x, tau, zdd);
        for (int i = 0; i < p->n; i++) {
            zd[i] = x.zd[i];
            s->z[i] += part[k] * h * zd[i], s->zd[i] += part[k] * h * zdd[i];
        }
    }
}

/* The first machine moves as chain_plant.h says. */
static int same_chain(void)
{
    const double none[MAXn] = {0};
    motion m = {{.6, -.5}, {.9, -.3}};
    state s = {{.6, -.5}, {.9, -.3}};
    double off = 0;
    for (int k = 0; k < 2000; k++)
        advance(&m, .001), step(machines, none, .001, &s);
    for (int i = 0; i < 2; i++)
        off = fmax(off, fabs(m.z[i] - s.z[i]) + fabs(m.zd[i] - s.zd[i]));
    return off < 1e-9;
}

/* ---- 2 runs ----------------------------------------------------------------------------------- */

static roln_real y[RUNS * (TICKS + 1) * MAXN], tau[RUNS * (TICKS + 1) * MAXN]; /* what is measured, NaN: dropped; torques */
static double truth[2][RUNS][TICKS + 1][MAXN];                                 /* q, qd */

static double uniform(uint64_t *seed, double low, double high)
{
    return low + (high - low) * (double)roln_uniform(seed);
}

static void simulate(const machine *p, int runs, uint64_t *seed)
{
    for (int r = 0; r < runs; r++) {
        double most[MAXn] = {0}, often[MAXn][3] = {{0}}, phase[MAXn][3] = {{0}};
        state s = {{0}, {0}};
        for (int j = 0; j < p->n; j++) {
            s.z[j] = uniform(seed, -p->start, p->start), s.zd[j] = uniform(seed, -p->speed, p->speed);
            most[j] = uniform(seed, p->low[j], p->high[j]);
            for (int k = 0; k < p->sines; k++)
                often[j][k] = uniform(seed, .2, p->fast), phase[j][k] = uniform(seed, 0, 2 * PI);
        }
        for (int t = 0; t <= TICKS; t++) {
            const int at = (r * (TICKS + 1) + t) * p->N, dropped = t > 0 && roln_randint(20, seed) == 0;
            const joints x = joints_of(p, &s);
            double u[MAXn] = {0};
            for (int i = 0; i < p->N; i++) {
                truth[0][r][t][i] = x.q[i], truth[1][r][t][i] = x.qd[i];
                y[at + i] = dropped ? (roln_real)NAN : (roln_real)(STEP * floor(x.q[i] / STEP + .5));
                tau[at + i] = 0;
            }
            for (int j = 0; j < p->n; j++) {
                for (int k = 0; k < p->sines; k++)
                    u[j] += most[j] * sin(2 * PI * often[j][k] * t * TICK + phase[j][k]);
                tau[at + p->N / p->n * j] = (roln_real)u[j];
            }
            for (int k = 0; k < 5; k++)
                step(p, u, TICK / 5, &s);
        }
    }
}

typedef struct { double q, qd; } error; /* sums of squares, at last rms of all joints, settled ticks, runs */

static void compare(const machine *p, int r, int t, const double *q, const double *qd, error *e)
{
    for (int i = 0; i < p->N; i++)
        e->q += pow(q[i] - truth[0][r][t][i], 2), e->qd += pow(qd[i] - truth[1][r][t][i], 2);
}

static error rms(const machine *p, error e)
{
    const double count = (double)RUNS * (TICKS - SETTLED) * p->N;
    return (error){sqrt(e.q / count), sqrt(e.qd / count)};
}

/* Critically damped alpha-beta (order 2) or alpha-beta-gamma filter of each joint, poles at x; a dropped sample is predicted. */
static error tracker(const machine *p, int order, double x)
{
    const double alpha = 1 - (order == 2 ? x * x : x * x * x), beta = (order == 2 ? 1 : 1.5 * (1 + x)) * (1 - x) * (1 - x) / TICK;
    const double gamma = order == 2 ? 0 : (1 - x) * (1 - x) * (1 - x) / (TICK * TICK);
    error e = {0, 0};
    for (int r = 0; r < RUNS; r++) {
        double q[MAXN], qd[MAXN] = {0}, qdd[MAXN] = {0};
        const roln_real *now = y + r * (TICKS + 1) * p->N;
        for (int i = 0; i < p->N; i++)
            q[i] = (double)now[i];
        for (int t = 1; t < TICKS; t++) {
            now += p->N;
            for (int i = 0; i < p->N; i++) {
                const double ahead = q[i] + TICK * qd[i] + TICK * TICK / 2 * qdd[i];
                const double d = isnan(now[i]) ? 0 : (double)now[i] - ahead;
                q[i] = ahead + alpha * d;
                qd[i] += TICK * qdd[i] + beta * d;
                qdd[i] += gamma * d;
            }
            if (t >= SETTLED) compare(p, r, t, q, qd, &e);
        }
    }
    return rms(p, e);
}

/* The best that it can do: poles chosen with hindsight, for q and for qd each on its own, among 0.5 .. 0.995. */
static error best_tracker(const machine *p, int order)
{
    error best = {HUGE_VAL, HUGE_VAL};
    for (int i = 0; i < 100; i++) {
        const error e = tracker(p, order, .5 + .005 * i);
        best.q = fmin(best.q, e.q), best.qd = fmin(best.qd, e.qd);
    }
    return best;
}

/* A model as this file uses it. noise: that of the filter, and the gains of the observer. start: estimates that know nothing.
   filter, observer: a tick, and the joints of the estimate. */
typedef struct {
    roln_status (*noise)(const roln_batch *b, roln_noise *noise);
    void (*start)(void);
    const roln_filter *(*filter)(const roln_noise *noise, const roln_real *y, const roln_real *tau, double *q, double *qd);
    const roln_filter *(*observer)(const roln_noise *noise, const roln_real *y, const roln_real *tau, double *q, double *qd);
} model;

#define MODEL(NAME, PARAMS) \
    static union { \
        NAME##_train train; NAME##_filter_tick_work filter; NAME##_observer_tick_work observer; NAME##_decode_work decode; \
    } NAME##_room; \
    static NAME##_filter NAME##_of; \
    static NAME##_observer NAME##_steady; \
    static NAME##_observer_gains NAME##_steady_gains; \
    static roln_status NAME##_noise(const roln_batch *b, roln_noise *noise) \
    { \
        const roln_status st = NAME##_fit_noise(PARAMS, b, noise, NULL, NULL, &NAME##_room.train.fit_noise); \
        return st != ROLN_OK ? st : NAME##_fit_observer(PARAMS, noise, b, &NAME##_steady_gains, &NAME##_room.train.fit_observer); \
    } \
    static void NAME##_begin(void) \
    { \
        memset(&NAME##_of, 0, sizeof NAME##_of), memset(&NAME##_steady, 0, sizeof NAME##_steady); \
    } \
    static void NAME##_joints(const NAME##_latent *s, double *q, double *qd) \
    { \
        NAME##_state x; \
        if (NAME##_decode(PARAMS, s, &x, &NAME##_room.decode) != ROLN_OK) exit(1); \
        for (int i = 0; i < NAME##_N; i++) \
            q[i] = (double)x.q[i], qd[i] = (double)x.qd[i]; \
    } \
    static const roln_filter *NAME##_next(const roln_noise *noise, const roln_real *now, const roln_real *torque, double *q, \
                                          double *qd) \
    { \
        NAME##_filter_tick(PARAMS, noise, now, torque, &NAME##_of, &NAME##_room.filter); \
        NAME##_joints(&NAME##_of.s, q, qd); \
        return &NAME##_of.f; \
    } \
    static const roln_filter *NAME##_watch(const roln_noise *noise, const roln_real *now, const roln_real *torque, double *q, \
                                           double *qd) \
    { \
        (void)noise; \
        NAME##_observer_tick(PARAMS, &NAME##_steady_gains, now, torque, &NAME##_steady, &NAME##_room.observer); \
        NAME##_joints(&NAME##_steady.s, q, qd); \
        return &NAME##_steady.f; \
    }
static pend2_params pend2;
static pend16_params pend16;
MODEL(chain, &chain_weights)
MODEL(pend2, &pend2)
MODEL(pend16, &pend16)
static const model models[3] = {
    {chain_noise, chain_begin, chain_next, chain_watch}, {pend2_noise, pend2_begin, pend2_next, pend2_watch},
    {pend16_noise, pend16_begin, pend16_next, pend16_watch}};

typedef struct { double nis, outliers, starts; } health; /* NIS of a joint, mean; counts */

static error estimated(const machine *p, const model *m, int steady, const roln_noise *noise, health *h)
{
    error e = {0, 0};
    double sum = 0, used = 0;
    *h = (health){0, 0, 0};
    for (int r = 0; r < RUNS; r++) {
        const roln_filter *f = NULL;
        m->start();
        for (int t = 0; t < TICKS; t++) {
            const int at = (r * (TICKS + 1) + t) * p->N;
            double q[MAXN], qd[MAXN];
            f = (steady ? m->observer : m->filter)(noise, y + at, t > 0 ? tau + at - p->N : NULL, q, qd);
            if (t < SETTLED) continue;
            compare(p, r, t, q, qd, &e);
            sum += (double)f->nis, used += f->used;
        }
        h->outliers += f->outliers, h->starts += f->starts;
    }
    h->nis = sum / used;
    return rms(p, e);
}

/* Nonzero if velocities of filter and observer are at least five times better than the best of every joint on its own. */
static int try(const machine *p, const model *m)
{
    const roln_batch b = {TUNE, TICKS, 1, NULL, y, NULL, NULL, p->sines ? tau : NULL};
    roln_noise noise = {.dt = (roln_real)TICK, .q = (roln_real)(STEP / sqrt(12)), .gate = 6, .lost = 5};
    uint64_t seed = 2027;
    error two, three, e, o;
    double best;
    health h, g;
    simulate(p, TUNE, &seed);
    if (m->noise(&b, &noise) != ROLN_OK) return 0;
    simulate(p, RUNS, &seed);
    two = best_tracker(p, 2), three = best_tracker(p, 3), e = estimated(p, m, 0, &noise, &h), o = estimated(p, m, 1, &noise, &g);
    best = fmin(two.qd, three.qd);
    printf("%-42s q, mrad qd, rad/s\n", p->name);
    printf("  alpha-beta per joint, best poles         %7.3f %9.4f\n", 1000 * two.q, two.qd);
    printf("  alpha-beta-gamma per joint, best poles   %7.3f %9.4f\n", 1000 * three.q, three.qd);
    printf("  NAME_filter_tick                         %7.3f %9.4f  velocity %.1f times better\n", 1000 * e.q, e.qd, best / e.qd);
    printf("  NAME_observer_tick                       %7.3f %9.4f  velocity %.1f times better\n", 1000 * o.q, o.qd, best / o.qd);
    printf("  noise of torques %.3g; NIS of a joint %.2f; %.0f outliers, %.0f starts in %d runs\n", (double)noise.tau, h.nis,
           h.outliers, h.starts, RUNS);
    return best / e.qd >= 5 && h.starts == RUNS && best / o.qd >= 5 && g.starts == RUNS;
}

/* Bytes of a .roln file. */
static int read(const char *directory, const char *name, int most, unsigned char *bytes)
{
    char path[1000];
    FILE *f;
    int count = 0;
    snprintf(path, sizeof path, "%s/%s", directory, name);
    f = fopen(path, "rb");
    if (f) count = (int)fread(bytes, 1, (size_t)most, f), fclose(f);
    return count;
}

int main(int argc, char **argv)
{
    static unsigned char bytes[pend16_packed_size + 1];
    const char *directory = argc > 1 ? argv[1] : "tests/mujoco/models";
    int good = same_chain();
    if (pend2_unpack(read(directory, "pend2_act.roln", sizeof bytes, bytes), bytes, &pend2) != ROLN_OK ||
        pend16_unpack(read(directory, "pend16_act.roln", sizeof bytes, bytes), bytes, &pend16) != ROLN_OK) {
        fprintf(stderr, "%s: no models\n", directory);
        return 1;
    }
    for (int k = 0; k < 3; k++)
        good += try(machines + k, models + k);
    printf("%d passed, %d failed\n", good, 4 - good);
    return good != 4;
}
