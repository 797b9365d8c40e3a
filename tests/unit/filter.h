/* SPDX-License-Identifier: MIT */
/* filter.h - what test_filter.c and test_noise.c share: the small models with a load or driven by torques, those whose filter looks
   ahead by leapfrog, a filter with what it is told, a machine that is the model and its recordings. Before it:
   FILTER_CALLS(X), functions that the file calls, LOADED_CALLS(X), those of models with a load (called.h). */
#ifndef FILTER_H
#define FILTER_H

/* The small models with a load. */
#define CALLED(X) LOADED_CALLS(X)
#define SMALL(name) name##_loaded
#define SMALL_LOAD 1
#include "small_models.h"

/* Those whose steps and filters are of leapfrog, without a load and with it. */
#define EVERY_FILTER leapfrog
#undef CALLED
#define CALLED(X) FILTER_CALLS(X)
#define SMALL(name) name##_leap
#define SMALL_STEP(scheme) leapfrog
#include "small_models.h"
#undef CALLED
#define CALLED(X) X(filter_tick)
#define SMALL(name) name##_leap_loaded
#define SMALL_STEP(scheme) leapfrog
#define SMALL_LOAD 1
#include "small_models.h"
#undef EVERY_FILTER

/* laden without its load; the same whose filter looks ahead by leapfrog, with steps of leapfrog and of RK4 */
#undef CALLED
#define CALLED(X) X(filter_tick)
#define ROLN_NAME unladen
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#include "called.h"
#define ROLN_NAME unladen_leap
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_INTEGRATOR leapfrog
#define ROLN_FILTER leapfrog
#include "called.h"
#define ROLN_NAME unladen_look
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_FILTER leapfrog
#include "called.h"

/* Those with learned inputs, driven by torques of the joints. */
#undef CALLED
#define CALLED(X) X(reduce)
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_driven
#define SMALL_INPUTS(count) 0
#include "small_models.h"

#undef CALLED
#define CALLED(X) FILTER_CALLS(X)
#include "small.h"

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

enum { SIDE = 3 * MAXN };

/* A filter, what it is told, and the range of its model. */
typedef struct {
    roln_filter f;
    roln_real z[MAXN], zd[MAXN], F[SIDE * SIDE], load[MAXN], zdd[MAXN]; /* zdd: of the last step of leapfrog */
} estimate;

typedef struct {
    roln_noise noise;
    roln_real q_each[MAXN], tau_each[MAXN], y[MAXN], tau[MAXN];
    estimate e;
} rig;

static roln_real theta_k[MAXP], z_min[MAXN], z_max[MAXN], zd_max[MAXN];
static int loaded; /* 1: the filters estimate a load, too */
static int leaps;  /* 1: models and filters of leapfrog */

ROLN_FN int side_of(int n)
{
    return (2 + loaded) * n;
}

#define LOADED_CALLED(name) name##_loaded_called
#define DRIVEN_CALLED(name) name##_driven_called
static const model *const with_load[MODELS] = SMALL_TABLE(LOADED_CALLED, LOADED_CALLED);
static const model *const driven[MODELS] = SMALL_TABLE(SMALL_CALLED, DRIVEN_CALLED);
#define LEAP_CALLED(name) name##_leap_called
#define LEAP_LOADED_CALLED(name) name##_leap_loaded_called
static const model *const leaping[MODELS] = SMALL_TABLE(LEAP_CALLED, LEAP_CALLED);
static const model *const leaping_with_load[MODELS] = SMALL_TABLE(LEAP_LOADED_CALLED, LEAP_LOADED_CALLED);

ROLN_FN instance filled(const model *of, int k)
{
    const instance m = {of, scale_of(k), z_min, z_max, zd_max, theta_k, NULL};
    return m;
}

ROLN_FN instance of_model(int k)
{
    return filled(leaps ? leaping[k] : models[k], k);
}

/* The model whose filter estimates what is to be estimated. */
ROLN_FN instance filter_of(int k)
{
    if (loaded) return filled(leaps ? leaping_with_load[k] : with_load[k], k);
    return k == LADEN ? filled(leaps ? &unladen_leap_called : &unladen_called, k) : of_model(k);
}

/* The state from which a step of leapfrog has its forces half a step on, by zdd, and back again (h < 0). */
ROLN_FN void half_ahead(int n, roln_real h, const roln_real *zdd, roln_real *z, roln_real *zd)
{
    int i;
    for (i = 0; i < n && leaps; i++)
        z[i] -= h * h / 4 * zdd[i], zd[i] += h / 2 * zdd[i];
}

ROLN_FN uint32_t tick_of(int k, const roln_noise *noise, const roln_real *y, const roln_real *tau, estimate *e)
{
    const instance m = filter_of(k);
    const filter_at to = {&e->f, e->z, e->zd, e->F, e->load, e->zdd};
    const int finite = roln_all_finite(n_OF(k), e->z); /* what is damaged stays so until it starts again */
    const uint32_t faults = m.of->filter_tick(&m, noise, y, tau, &to, room_of(m.of->scratch.filter_tick));
    ROOM_KEPT();
    CHECK((faults & ~e->f.faults) == 0);
    CHECK(roln_all_finite(n_OF(k), e->z) || !finite);
    CHECK(roln_all_finite(n_OF(k), e->zd) && roln_all_finite(n_OF(k), e->load));
    CHECK(roln_all_finite(side_of(n_OF(k)) * side_of(n_OF(k)), e->F));
    CHECK(all(MAXN - n_OF(k), e->z + n_OF(k), 0) && all(MAXN - n_OF(k), e->zd + n_OF(k), 0)); /* and nothing behind them */
    return faults;
}

/* Model k with random weights, and a range around 0; noise of every joint its own; a pose, and the estimate there with the factor
   of a covariance of size `wide`. */
ROLN_FN void place(int k, uint64_t *s, roln_real wide, rig *x)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), side = side_of(n);
    roln_real qd[MAXN];
    int i;
    memset(x, 0, sizeof *x);
    parameters(k, s, theta_k);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta_k, s, ROOM(init)));
    fill(MAXN, -4, z_min), fill(MAXN, 4, z_max), fill(MAXN, 8, zd_max);
    dyadic(N, ROLN_C(0.25), s, x->q_each), dyadic(N, ROLN_C(0.25), s, x->tau_each), dyadic(F_OF(k), ROLN_C(0.25), s, x->tau);
    for (i = 0; i < N; i++)
        x->q_each[i] = ROLN_C(0.001953125) * (1 + x->q_each[i]), x->tau_each[i] = ROLN_C(0.5) + x->tau_each[i];
    x->noise.dt = dt / 4, x->noise.q = ROLN_C(0.001953125), x->noise.tau = ROLN_C(0.5), x->noise.lost = 3;
    x->noise.q_each = x->q_each, x->noise.tau_each = x->tau_each;
    dyadic(n, ROLN_C(0.5), s, x->e.z), dyadic(n, ROLN_C(0.5), s, x->e.zd);
    dyadic(side * side, loaded ? wide / 4 : wide / 2, s, x->e.F); /* not singular, which is likelier of 3n */
    for (i = 0; i < side; i++)
        x->e.F[i * (side + 1)] += wide;
    if (loaded) dyadic(n, ROLN_C(0.5), s, x->e.load), x->noise.load = ROLN_C(0.75);
    x->e.f.valid = 1, x->e.f.starts = 1;
    CHECK_OK(m.of->decode(&m, x->e.z, x->e.zd, x->y, qd, spare));
    for (i = 0; i < N; i++)
        x->y[i] += ROLN_C(0.001953125) * roln_normal(s);
}

/* ---- a machine that is the model --------------------------------------------------------------- */

static roln_real burden[MAXN]; /* the load, with `loaded` */
static roln_real last[MAXN];   /* zdd of the last step, with `leaps` */
static int restless;           /* 1: it wanders */

/* One tick of a machine that is the model, pushed by unknown torques, and its measured positions. */
ROLN_FN void simulate(int k, const rig *x, uint64_t *s, roln_real *z, roln_real *zd, roln_real *y)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real tau_z[MAXN], push[MAXN], mass[MAXN * MAXN], L[MAXN * MAXN], qd[MAXN], before[MAXN];
    const terms_at out = {mass, NULL, NULL, NULL, NULL, NULL};
    const instance by_joints = filled(driven[k], k);
    int i;
    half_ahead(n, x->noise.dt, last, z, zd), memcpy(before, zd, (size_t)n * sizeof *zd);
    CHECK_OK(m.of->push(&m, z, zd, x->tau, loaded ? burden : NULL, x->noise.dt, spare));
    for (i = 0; i < n; i++)
        before[i] = (zd[i] - before[i]) / x->noise.dt;
    half_ahead(n, -x->noise.dt, last, z, zd), memcpy(last, before, (size_t)n * sizeof *zd);
    for (i = 0; i < N; i++)
        push[i] = x->tau_each[i] * roln_normal(s);
    CHECK_OK(by_joints.of->reduce(&by_joints, z, push, tau_z, spare));
    CHECK_OK(m.of->dynamics(&m, z, zd, &out, spare));
    CHECK_OK(roln_chol(n, mass, L));
    roln_solve_lower(n, L, tau_z, tau_z), roln_solve_lower_t(n, L, tau_z, tau_z);
    for (i = 0; i < n; i++) {
        z[i] += x->noise.dt * x->noise.dt / 2 * tau_z[i];
        zd[i] += x->noise.dt * tau_z[i];
        if (roln_lnn_angle(&m.of->md->lnn, i)) z[i] = roln_wrap(z[i]);
    }
    if (loaded && restless) {
        for (i = 0; i < N; i++)
            push[i] = ROLN_SQRT(x->noise.dt) * x->noise.load * roln_normal(s);
        CHECK_OK(by_joints.of->reduce(&by_joints, z, push, tau_z, spare));
        for (i = 0; i < n; i++)
            burden[i] += tau_z[i];
    }
    CHECK_OK(m.of->decode(&m, z, zd, y, qd, spare));
    for (i = 0; i < N; i++)
        y[i] += x->q_each[i] * roln_normal(s);
}

/* ---- recordings ------------------------------------------------------------------------------- */

enum { RECORDINGS = 2, SAMPLES = 200 };
static roln_real recorded[RECORDINGS * SAMPLES * MAXN], torques[RECORDINGS * SAMPLES * MAXN];

/* Motion of model k under torques, with noise of x. */
ROLN_FN roln_batch record(int k, const rig *x, uint64_t *s)
{
    const roln_batch b = {RECORDINGS, SAMPLES - 1, 1, NULL, recorded, NULL, NULL, torques};
    const int N = N_OF(k), F = F_OF(k);
    int w, t, i;
    for (w = 0; w < RECORDINGS; w++) {
        static rig now;
        roln_real z[MAXN], zd[MAXN], y[MAXN];
        now = *x;
        memcpy(z, x->e.z, sizeof z), memcpy(zd, x->e.zd, sizeof zd);
        for (t = 0; t < SAMPLES; t++) {
            simulate(k, &now, s, z, zd, y);
            memcpy(recorded + (w * SAMPLES + t) * N, y, (size_t)N * sizeof *y);
            for (i = 0; i < F; i++)
                now.tau[i] = x->tau[i] * (roln_real)((t / 20) % 2);
            memcpy(torques + (w * SAMPLES + t) * F, now.tau, (size_t)F * sizeof *now.tau);
        }
    }
    return b;
}

#endif
