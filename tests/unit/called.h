/* SPDX-License-Identifier: MIT */
/* called.h - include in place of roln.h, for every model of a test that is one function over many models. Behind the model it
   defines `static const model NAME_called`: sizes, scratch, and the functions NAME_x as pointers whose types are the same for all
   models.

       #define CALLED(X) X(encode) X(decode)     the functions that this file calls, once; no others are compiled
       #define ROLN_NAME plain
       #define ROLN_AE 6, 4, 2
       #define ROLN_MLP 5, 4
       #include "called.h"

       const instance m = {&plain_called, &scale, z_min, z_max, zd_max, theta, NULL};
       st = m.of->decode(&m, z, zd, q, qd, room_of(m.of->scratch.decode));

   CALLED_ALSO, if it is defined, names a header that is included behind every model, too: what one file alone wants of each. There
   C_(x) is NAME_x.

   Arguments are arrays of numbers in place of structs; a call copies them into the structs of its model, which it calls as a user
   does, and back. Arrays that are only written keep what they had where NAME_x leaves them alone. */
#define CALLED_OWN_common 0
#define CALLED_OWN_each 1
#define CALLED_OWN_ROLN_SCALE 0 /* not defined */
#define CALLED_OWN__(s) CALLED_OWN_##s
#define CALLED_OWN_(s) CALLED_OWN__(s)
#define CALLED_LEAPS_model 0
#define CALLED_LEAPS_leapfrog 1
#define CALLED_LEAPS_ROLN_FILTER 0
#define CALLED_LEAPS__(s) CALLED_LEAPS_##s
#define CALLED_LEAPS_(s) CALLED_LEAPS__(s)
#define CALLED_FIRST__(a, ...) a
#define CALLED_FIRST_(...) CALLED_FIRST__(__VA_ARGS__, 0)

#ifdef ROLN_NAME
#ifndef CALLED
#error "CALLED(X): the functions that this file calls, X(encode) X(decode) .."
#endif

/* For variants of many models: an option that all have from here on, whatever they say themselves. */
#ifdef EVERY_BLOCK
#undef ROLN_BLOCK
#define ROLN_BLOCK EVERY_BLOCK
#endif
#ifdef EVERY_HORIZON
#undef ROLN_HORIZON
#define ROLN_HORIZON EVERY_HORIZON
#endif
#ifdef EVERY_DELAY
#undef ROLN_DELAY
#define ROLN_DELAY EVERY_DELAY
#endif
#ifdef EVERY_FILTER
#undef ROLN_FILTER
#define ROLN_FILTER EVERY_FILTER
#endif
#ifdef EVERY_LEARN
#undef ROLN_LEARN
#define ROLN_LEARN EVERY_LEARN
#endif

/* Options that a function or a member depends on; roln.h undefines them. */
#if CALLED_OWN_(ROLN_SCALE) > 0
#define CALLED_EACH
#endif
#if defined ROLN_LOAD && ROLN_LOAD > 0
#define CALLED_LOAD
#endif
#if CALLED_LEAPS_(ROLN_FILTER) > 0
#define CALLED_LEAPS
#endif
#if defined ROLN_DELAY && ROLN_DELAY > 0
#define CALLED_DELAY
#endif
#if defined ROLN_FRICTION && ROLN_FRICTION > 0
#define CALLED_FRICTION
#endif
#ifdef ROLN_PLAN
#if CALLED_FIRST_(ROLN_PLAN) > 0
#define CALLED_PLAN
#endif
#endif
#if defined ROLN_GN_ROWS && ROLN_GN_ROWS > 0
#define CALLED_ROWS
#endif
#ifndef ROLN_BLOCK
#define ROLN_BLOCK 16
#endif
#define CALLED_BLOCK_NAME_(a) a##_called_block
#define CALLED_BLOCK_NAME(a) CALLED_BLOCK_NAME_(a)
enum { CALLED_BLOCK_NAME(ROLN_NAME) = ROLN_BLOCK };
#pragma push_macro("ROLN_NAME")
#include "roln.h"
#pragma pop_macro("ROLN_NAME")
#else
#include "roln.h"
#endif

#ifndef CALLED_H
#define CALLED_H

typedef struct model_of model;

/* A model with its numbers. z_min, z_max, zd_max NULL: no range. each NULL: no units of their own, or 1. */
typedef struct {
    const model *of;
    const roln_scale *scale;
    const roln_real *z_min, *z_max, *zd_max, *theta, *each;
} instance;

/* NAME_target, NAME_guard, NAME_equation, NAME_filter, NAME_plan, by pointers. load: only of models with ROLN_LOAD. */
typedef struct { const roln_real *z, *zd, *zdd, *kp, *kd, *load; } target_at;
typedef struct { roln_guard *g; roln_real *tau; } guard_at; /* behind tau, sent [delay][force_size] */
typedef struct { roln_real *M, *c, *g, *d, *T, *V; } terms_at; /* NULL: not wanted */
typedef struct { roln_filter *f; roln_real *z, *zd, *F, *load, *zdd; } filter_at; /* zdd: only of those of leapfrog */
typedef struct { roln_real *A, *B, *L; } slopes_at;
typedef struct { roln_plan *plan; roln_real *s, *u, *K; } plan_at;

/* Every function with scratch that a model has: X(of, where, function), `where` its union or, alone, the type of its scratch. */
#define CALLED_WORK(X, of) \
    X(of, work, encode) X(of, work, encode_reference) X(of, work, decode) X(of, work, step) X(of, work, reduce) X(of, work, lift) \
    X(of, work, dynamics) X(of, work, inverse) X(of, work, inertia) X(of, work, control) X(of, work, allocate) X(of, work, gains) \
    X(of, work, guard_tick) X(of, work, tick) X(of, train, fit_range) X(of, train, fit_limits) X(of, train, fit_noise) \
    X(of, train, grad) X(of, train, grad_acc) X(of, train, update) X(of, train, variance) X(of, train, fit_inertia) \
    X(of, train, force_variance) X(of, train, errors) X(of, start, init)
#define CALLED_ALONE(X, of) X(of, linear) X(of, lqr) X(of, lqr_along) X(of, filter_tick)
#define CALLED_PLANS(X, of) X(of, plan_next) X(of, plan_linear)
#define NUMBERS_OF(type, member) ((int)(sizeof(((type *)0)->member) / sizeof(roln_real)))
#define CALLED_FIELD(of, where, function) int function;
#define CALLED_FIELD_ALONE(of, function) int function;
typedef struct {
    CALLED_WORK(CALLED_FIELD, ) CALLED_ALONE(CALLED_FIELD_ALONE, ) CALLED_PLANS(CALLED_FIELD_ALONE, )
} scratch_sizes;

struct model_of {
    const char *name;
    const roln_model *md;
    const roln_block *table;
    int blocks, params, moments, packed, horizon, block;
    int N, n, force_size, motors, steps, load, own, formed, base, delay, of_ahead; /* scratch of ahead */
    scratch_sizes scratch;
    roln_status (*encode)(const instance *m, const roln_real *q, const roln_real *qd, roln_real *z, roln_real *zd, void *work);
    roln_status (*encode_reference)(const instance *m, const roln_real *q, const roln_real *qd, const roln_real *qdd, roln_real *z,
                       roln_real *zd, roln_real *zdd, void *work);
    roln_status (*decode)(const instance *m, const roln_real *z, const roln_real *zd, roln_real *q, roln_real *qd, void *work);
    roln_status (*step)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt, void *work);
    roln_status (*linear)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt, roln_real *A,
                          roln_real *B, void *work);
    /* a step under tau and a load, each may be NULL, as a filter takes it, and its derivatives A, B, L, each may be NULL */
    roln_status (*push)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, const roln_real *load, roln_real dt,
                        void *work);
    roln_status (*slopes)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, const roln_real *load, roln_real dt,
                          const slopes_at *to, void *work);
    roln_status (*reduce)(const instance *m, const roln_real *z, const roln_real *tau, roln_real *tau_z, void *work);
    roln_status (*lift)(const instance *m, const roln_real *z, const roln_real *tau_z, roln_real *tau, void *work);
    roln_status (*dynamics)(const instance *m, const roln_real *z, const roln_real *zd, const terms_at *out, void *work);
    roln_status (*inverse)(const instance *m, const roln_real *z, const roln_real *zd, const roln_real *w, const roln_real *zdd,
                           roln_real *tau_z, void *work);
    roln_status (*inertia)(const instance *m, const roln_real *z, const roln_real *v, roln_real *y, void *work);
    roln_status (*friction_of)(const instance *m, roln_real *c, roln_real *v);
    int (*in_range)(const instance *m, const roln_real *z, const roln_real *zd);
    roln_status (*fit_range)(const instance *m, int count, const roln_real *q, const roln_real *qd, roln_real *z_min,
                             roln_real *z_max, roln_real *zd_max, void *work);
    roln_status (*control)(const instance *m, const roln_real *z, const roln_real *zd, const target_at *r, roln_real *tau_z,
                           void *work);
    roln_status (*gains)(const instance *m, const roln_real *z, const roln_real *Kp, const roln_real *Kd, roln_real *kp,
                         roln_real *kd, void *work);
    roln_status (*allocate)(const instance *m, const roln_real *z, const roln_motors *motors, const roln_real *tau_z, roln_real *u,
                            roln_real *missed, void *work);
    uint32_t (*guard_tick)(const instance *m, const roln_limits *limits, const roln_real *q, const roln_real *qd,
                           const roln_real *z, const roln_real *zd, const roln_real *want, const guard_at *g, void *work);
    /* only of models with ROLN_DELAY */
    roln_status (*ahead)(const instance *m, const roln_limits *limits, const guard_at *g, const roln_real *load, roln_real *z,
                         roln_real *zd, void *work);
    uint32_t (*tick)(const instance *m, const roln_limits *limits, const roln_real *q, const roln_real *qd, const target_at *r,
                     roln_real *z, roln_real *zd, const guard_at *g, void *work);
    roln_status (*lqr)(const instance *m, const roln_cost *cost, const roln_real *s, const roln_real *u, roln_real *K, roln_real *P,
                       void *work);
    roln_status (*lqr_along)(const instance *m, const roln_cost *cost, int count, const roln_real *s, const roln_real *u,
                             const roln_real *P, roln_real *K, void *work);
    uint32_t (*filter_tick)(const instance *m, const roln_noise *noise, const roln_real *y, const roln_real *tau,
                            const filter_at *f, void *work);
    roln_status (*plan_next)(const instance *m, const roln_goal *goal, const roln_real *s, const plan_at *pl, void *work);
    roln_status (*plan_follow)(const instance *m, const roln_goal *goal, const plan_at *pl, roln_real t, const roln_real *s,
                               roln_real *u);
    roln_status (*plan_linear)(const instance *m, const roln_goal *goal, const plan_at *pl, roln_real *A, roln_real *B,
                               roln_real *c, void *work);
    roln_status (*fit_limits)(const instance *m, const roln_batch *b, roln_real slack, roln_limits *l, roln_real *tau_each,
                              roln_real *rate_each, void *work);
    roln_status (*fit_noise)(const instance *m, const roln_batch *b, roln_noise *noise, roln_real *q_each, roln_real *tau_each,
                             void *work);
    roln_status (*variance)(const instance *m, const roln_batch *b, roln_loss *var, void *work);
    roln_status (*fit_inertia)(const instance *m, const roln_batch *b, roln_real *scale_m, void *work);
    roln_status (*force_variance)(const instance *m, const roln_batch *b, roln_real *variance, void *work);
    /* g: NAME_gradient, numbers only: theta [params], roln_loss, windows, and as many again */
    roln_status (*grad)(const instance *m, const roln_loss *weights, const roln_batch *b, roln_real dt, void *g, void *work);
    roln_status (*grad_acc)(const instance *m, const roln_loss *weights, const roln_batch *b, void *g, void *work);
    /* J [ROLN_GN_ROWS][newton_size], NULL: not wanted, r [ROLN_GN_ROWS] out; only of models with ROLN_GN_ROWS */
    roln_status (*rows)(const instance *m, const roln_loss *weights, const roln_batch *b, roln_real dt, uint64_t seed, roln_real *J,
                        roln_real *r, void *work);
    roln_status (*errors)(const instance *m, const roln_batch *b, roln_real dt, int every, const roln_real *qbar,
                          const roln_errors *e, void *work);
};

/* Numbers of NAME_gradient beside theta, twice. */
#define GRADIENT_REST ((int)(sizeof(roln_loss) / sizeof(roln_real)) + 1)
#define GRADIENT_SIZE(params) (2 * ((params) + GRADIENT_REST))

#define C_(x) ROLNI_CAT(ROLN_NAME, x)
#define CALLED_SIZE(of, where, function) .function = NUMBERS_OF(ROLNI_CAT(of, where), function),
#define CALLED_SIZE_ALONE(of, function) .function = (int)(sizeof(ROLNI_CAT(of, function##_work)) / sizeof(roln_real)),
#define CALLED_ENTRY(function) .function = C_(c_##function),

/* Copy n numbers, if there are any. */
ROLN_FN void copied(int n, const roln_real *from, roln_real *to)
{
    if (from) memcpy(to, from, (size_t)n * sizeof *to);
}
#endif

#ifdef ROLN_NAME
ROLN_FN C_(params) C_(c_params)(const instance *m)
{
    C_(params) p;
    memset(&p, 0, sizeof p);
    p.slope = C_(model).ae.slope, p.eigenvalue_floor = C_(model).lnn.eigenvalue_floor, p.scale = *m->scale;
    copied(C_(n), m->z_min, p.z_min), copied(C_(n), m->z_max, p.z_max), copied(C_(n), m->zd_max, p.zd_max);
    copied(C_(theta_size), m->theta, p.theta);
#ifdef CALLED_EACH
    {
        int i;
        for (i = 0; i < C_(N); i++)
            p.each[i] = m->each ? m->each[i] : 1;
    }
#endif
    return p;
}

ROLN_FN C_(state) C_(c_state)(const roln_real *q, const roln_real *qd)
{
    C_(state) x;
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    return x;
}

ROLN_FN C_(latent) C_(c_latent)(const roln_real *z, const roln_real *zd)
{
    C_(latent) s;
    memcpy(s.z, z, sizeof s.z);
    if (zd) memcpy(s.zd, zd, sizeof s.zd);
    else memset(s.zd, 0, sizeof s.zd);
    return s;
}

ROLN_FN C_(target) C_(c_target)(const target_at *r)
{
    C_(target) to;
    memset(&to, 0, sizeof to);
    copied(C_(n), r->z, to.z), copied(C_(n), r->zd, to.zd), copied(C_(n), r->zdd, to.zdd);
    copied(C_(n), r->kp, to.kp), copied(C_(n), r->kd, to.kd);
#ifdef CALLED_LOAD
    to.load = r->load;
#endif
    return to;
}

ROLN_FN roln_status C_(c_encode)(const instance *m, const roln_real *q, const roln_real *qd, roln_real *z, roln_real *zd,
                                 void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(state) x = C_(c_state)(q, qd);
    C_(latent) s = C_(c_latent)(z, zd);
    const roln_status st = C_(encode)(&p, &x, &s, (C_(encode_work) *)work);
    memcpy(z, s.z, sizeof s.z), memcpy(zd, s.zd, sizeof s.zd);
    return st;
}

ROLN_FN roln_status C_(c_encode_reference)(const instance *m, const roln_real *q, const roln_real *qd, const roln_real *qdd,
                                           roln_real *z, roln_real *zd, roln_real *zdd, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const target_at was = {z, zd, zdd, NULL, NULL, NULL};
    C_(target) r = C_(c_target)(&was);
    const roln_status st = C_(encode_reference)(&p, q, qd, qdd, &r, (C_(encode_reference_work) *)work);
    memcpy(z, r.z, sizeof r.z), memcpy(zd, r.zd, sizeof r.zd), memcpy(zdd, r.zdd, sizeof r.zdd);
    return st;
}

ROLN_FN roln_status C_(c_decode)(const instance *m, const roln_real *z, const roln_real *zd, roln_real *q, roln_real *qd,
                                 void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, zd);
    C_(state) x = C_(c_state)(q, qd);
    const roln_status st = C_(decode)(&p, &s, &x, (C_(decode_work) *)work);
    memcpy(q, x.q, sizeof x.q), memcpy(qd, x.qd, sizeof x.qd);
    return st;
}

ROLN_FN roln_status C_(c_step)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt, void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(latent) s = C_(c_latent)(z, zd);
    const roln_status st = C_(step)(&p, &s, tau, dt, (C_(step_work) *)work);
    memcpy(z, s.z, sizeof s.z), memcpy(zd, s.zd, sizeof s.zd);
    return st;
}

ROLN_FN roln_status C_(c_linear)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt, roln_real *A,
                                 roln_real *B, void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(latent) s = C_(c_latent)(z, zd);
    C_(jacobian) j;
    roln_status st;
    memcpy(j.A, A, sizeof j.A), memcpy(j.B, B, sizeof j.B);
    st = C_(linear)(&p, &s, tau, dt, &j, (C_(linear_work) *)work);
    memcpy(z, s.z, sizeof s.z), memcpy(zd, s.zd, sizeof s.zd);
    memcpy(A, j.A, sizeof j.A), memcpy(B, j.B, sizeof j.B);
    return st;
}

ROLN_FN roln_status C_(c_push)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, const roln_real *load,
                               roln_real dt, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const rolni_push by = {tau, load, dt, 0};
    return C_(i_step)(&p, z, zd, &by, (C_(step_work) *)work);
}

ROLN_FN roln_status C_(c_slopes)(const instance *m, roln_real *z, roln_real *zd, const roln_real *tau, const roln_real *load,
                                 roln_real dt, const slopes_at *to, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const rolni_push by = {tau, load, dt, 0};
    const rolni_slopes out = {to->A, to->B, to->L};
    C_(i_linear_base) *w = (C_(i_linear_base) *)work;
    roln_real *J = (roln_real *)(void *)(w + 1);
    return C_(i_linear)(&p, z, zd, &by, &out, w, J, J + 4 * C_(n) * C_(n) + 2 * C_(n) * ROLN_MAX(C_(n), C_(force_size)));
}
ROLN_FN roln_status C_(c_reduce)(const instance *m, const roln_real *z, const roln_real *tau, roln_real *tau_z, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, NULL);
    return C_(reduce)(&p, &s, tau, tau_z, (C_(reduce_work) *)work);
}

ROLN_FN roln_status C_(c_lift)(const instance *m, const roln_real *z, const roln_real *tau_z, roln_real *tau, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, NULL);
    return C_(lift)(&p, &s, tau_z, tau, (C_(lift_work) *)work);
}

ROLN_FN roln_status C_(c_dynamics)(const instance *m, const roln_real *z, const roln_real *zd, const terms_at *out, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, zd);
    C_(equation) e;
    const roln_status st = C_(dynamics)(&p, &s, &e, (C_(dynamics_work) *)work);
    if (st != ROLN_OK) return st;
    if (out->M) memcpy(out->M, e.M, sizeof e.M);
    if (out->c) memcpy(out->c, e.c, sizeof e.c);
    if (out->g) memcpy(out->g, e.g, sizeof e.g);
    if (out->d) memcpy(out->d, e.d, sizeof e.d);
    if (out->T) *out->T = e.T;
    if (out->V) *out->V = e.V;
    return st;
}

ROLN_FN roln_status C_(c_inverse)(const instance *m, const roln_real *z, const roln_real *zd, const roln_real *w,
                                  const roln_real *zdd, roln_real *tau_z, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, zd);
    return C_(inverse)(&p, &s, w, zdd, tau_z, (C_(inverse_work) *)work);
}

ROLN_FN roln_status C_(c_inertia)(const instance *m, const roln_real *z, const roln_real *v, roln_real *y, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, NULL);
    return C_(inertia)(&p, &s, v, y, (C_(inertia_work) *)work);
}

/* 0 of a model without friction. */
ROLN_FN roln_status C_(c_friction_of)(const instance *m, roln_real *c, roln_real *v)
{
#ifdef CALLED_FRICTION
    const C_(params) p = C_(c_params)(m);
    return C_(friction_of)(&p, c, v);
#else
    (void)m;
    memset(c, 0, C_(n) * sizeof *c), memset(v, 0, C_(n) * sizeof *v);
    return ROLN_OK;
#endif
}

ROLN_FN int C_(c_in_range)(const instance *m, const roln_real *z, const roln_real *zd)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, zd);
    return C_(in_range)(&p, &s);
}

ROLN_FN roln_status C_(c_fit_range)(const instance *m, int count, const roln_real *q, const roln_real *qd, roln_real *z_min,
                                    roln_real *z_max, roln_real *zd_max, void *work)
{
    C_(params) p = C_(c_params)(m);
    roln_status st;
    memcpy(p.z_min, z_min, sizeof p.z_min), memcpy(p.z_max, z_max, sizeof p.z_max), memcpy(p.zd_max, zd_max, sizeof p.zd_max);
    st = C_(fit_range)(&p, count, q, qd, (C_(fit_range_work) *)work);
    memcpy(z_min, p.z_min, sizeof p.z_min), memcpy(z_max, p.z_max, sizeof p.z_max), memcpy(zd_max, p.zd_max, sizeof p.zd_max);
    return st;
}

ROLN_FN roln_status C_(c_control)(const instance *m, const roln_real *z, const roln_real *zd, const target_at *r, roln_real *tau_z,
                                  void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, zd);
    const C_(target) to = C_(c_target)(r);
    return C_(control)(&p, &s, &to, tau_z, (C_(control_work) *)work);
}

ROLN_FN roln_status C_(c_gains)(const instance *m, const roln_real *z, const roln_real *Kp, const roln_real *Kd, roln_real *kp,
                                roln_real *kd, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, NULL);
    const target_at was = {NULL, NULL, NULL, kp, kd, NULL};
    C_(target) r = C_(c_target)(&was);
    const roln_status st = C_(gains)(&p, &s, Kp, Kd, &r, (C_(gains_work) *)work);
    memcpy(kp, r.kp, sizeof r.kp), memcpy(kd, r.kd, sizeof r.kd);
    return st;
}

ROLN_FN roln_status C_(c_allocate)(const instance *m, const roln_real *z, const roln_motors *motors, const roln_real *tau_z,
                                   roln_real *u, roln_real *missed, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) s = C_(c_latent)(z, NULL);
    return C_(allocate)(&p, &s, motors, tau_z, u, missed, (C_(allocate_work) *)work);
}

ROLN_FN C_(guard) C_(c_guard)(const guard_at *from)
{
    C_(guard) g;
    g.g = *from->g, memcpy(g.tau, from->tau, sizeof g.tau);
#ifdef CALLED_DELAY
    memcpy(g.sent, from->tau + C_(force_size), sizeof g.sent);
#endif
    return g;
}

ROLN_FN void C_(c_guarded)(const C_(guard) *g, const guard_at *to)
{
    *to->g = g->g, memcpy(to->tau, g->tau, sizeof g->tau);
#ifdef CALLED_DELAY
    memcpy(to->tau + C_(force_size), g->sent, sizeof g->sent);
#endif
}

#ifdef CALLED_DELAY
ROLN_FN roln_status C_(c_ahead)(const instance *m, const roln_limits *limits, const guard_at *g, const roln_real *load,
                                roln_real *z, roln_real *zd, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(guard) of = C_(c_guard)(g);
    C_(latent) s = C_(c_latent)(z, zd);
    const roln_status st = C_(ahead)(&p, limits, &of, load, &s, (C_(ahead_work) *)work);
    memcpy(z, s.z, sizeof s.z), memcpy(zd, s.zd, sizeof s.zd);
    return st;
}
#endif

/* z NULL: the encoder failed. */
ROLN_FN uint32_t C_(c_guard_tick)(const instance *m, const roln_limits *limits, const roln_real *q, const roln_real *qd,
                                  const roln_real *z, const roln_real *zd, const roln_real *want, const guard_at *g, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(state) x = C_(c_state)(q, qd);
    C_(latent) s;
    C_(guard) to = C_(c_guard)(g);
    uint32_t faults;
    if (z) s = C_(c_latent)(z, zd);
    faults = C_(guard_tick)(&p, limits, &x, z ? &s : NULL, want, &to, (C_(guard_tick_work) *)work);
    C_(c_guarded)(&to, g);
    return faults;
}

ROLN_FN uint32_t C_(c_tick)(const instance *m, const roln_limits *limits, const roln_real *q, const roln_real *qd,
                            const target_at *r, roln_real *z, roln_real *zd, const guard_at *g, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(state) x = C_(c_state)(q, qd);
    const C_(target) ref = C_(c_target)(r);
    C_(latent) s = C_(c_latent)(z, zd);
    C_(guard) to = C_(c_guard)(g);
    uint32_t faults;
    faults = C_(tick)(&p, limits, &x, &ref, &s, &to, (C_(tick_work) *)work);
    C_(c_guarded)(&to, g);
    memcpy(z, s.z, sizeof s.z), memcpy(zd, s.zd, sizeof s.zd);
    return faults;
}

ROLN_FN roln_status C_(c_lqr)(const instance *m, const roln_cost *cost, const roln_real *s, const roln_real *u, roln_real *K,
                              roln_real *P, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) at = C_(c_latent)(s, s + C_(n));
    return C_(lqr)(&p, cost, &at, u, K, P, (C_(lqr_work) *)work);
}

ROLN_FN roln_status C_(c_lqr_along)(const instance *m, const roln_cost *cost, int count, const roln_real *s, const roln_real *u,
                                    const roln_real *P, roln_real *K, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(lqr_along)(&p, cost, count, (const C_(latent) *)(const void *)s, u, P, K, (C_(lqr_along_work) *)work);
}

ROLN_FN uint32_t C_(c_filter_tick)(const instance *m, const roln_noise *noise, const roln_real *y, const roln_real *tau,
                                   const filter_at *f, void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(filter) to;
    uint32_t faults;
    to.f = *f->f, to.s = C_(c_latent)(f->z, f->zd), memcpy(to.F, f->F, sizeof to.F);
#ifdef CALLED_LOAD
    memcpy(to.load, f->load, sizeof to.load);
#endif
#ifdef CALLED_LEAPS
    memcpy(to.zdd, f->zdd, sizeof to.zdd);
#endif
    faults = C_(filter_tick)(&p, noise, y, tau, &to, (C_(filter_tick_work) *)work);
    *f->f = to.f, memcpy(f->z, to.s.z, sizeof to.s.z), memcpy(f->zd, to.s.zd, sizeof to.s.zd), memcpy(f->F, to.F, sizeof to.F);
#ifdef CALLED_LOAD
    memcpy(f->load, to.load, sizeof to.load);
#endif
#ifdef CALLED_LEAPS
    memcpy(f->zdd, to.zdd, sizeof to.zdd);
#endif
    return faults;
}

#ifdef CALLED_PLAN
ROLN_FN void C_(c_plan)(const plan_at *from, C_(plan) *to)
{
    memset(to, 0, sizeof *to); /* derivatives are not kept from call to call: test_plan.c: test_kept */
    to->plan = *from->plan;
    memcpy(to->s, from->s, sizeof to->s), memcpy(to->u, from->u, sizeof to->u), memcpy(to->K, from->K, sizeof to->K);
}

ROLN_FN void C_(c_planned)(const C_(plan) *from, const plan_at *to)
{
    *to->plan = from->plan;
    memcpy(to->s, from->s, sizeof from->s), memcpy(to->u, from->u, sizeof from->u), memcpy(to->K, from->K, sizeof from->K);
}

ROLN_FN roln_status C_(c_plan_next)(const instance *m, const roln_goal *goal, const roln_real *s, const plan_at *pl, void *work)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) at = C_(c_latent)(s, s + C_(n));
    C_(plan) plan;
    roln_status st;
    C_(c_plan)(pl, &plan);
    st = C_(plan_next)(&p, goal, &at, &plan, (C_(plan_next_work) *)work);
    C_(c_planned)(&plan, pl);
    return st;
}

ROLN_FN roln_status C_(c_plan_follow)(const instance *m, const roln_goal *goal, const plan_at *pl, roln_real t, const roln_real *s,
                                      roln_real *u)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) at = C_(c_latent)(s, s + C_(n));
    C_(plan) plan;
    C_(c_plan)(pl, &plan);
    return C_(plan_follow)(&p, goal, &plan, t, &at, u);
}

ROLN_FN roln_status C_(c_plan_linear)(const instance *m, const roln_goal *goal, const plan_at *pl, roln_real *A, roln_real *B,
                                      roln_real *c, void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(plan) plan;
    C_(c_plan)(pl, &plan);
    return C_(plan_linear)(&p, goal, &plan, A, B, c, (C_(plan_linear_work) *)work);
}
#endif

ROLN_FN roln_status C_(c_fit_limits)(const instance *m, const roln_batch *b, roln_real slack, roln_limits *l, roln_real *tau_each,
                                     roln_real *rate_each, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(fit_limits)(&p, b, slack, l, tau_each, rate_each, (C_(fit_limits_work) *)work);
}

ROLN_FN roln_status C_(c_fit_noise)(const instance *m, const roln_batch *b, roln_noise *noise, roln_real *q_each,
                                    roln_real *tau_each, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(fit_noise)(&p, b, noise, q_each, tau_each, (C_(fit_noise_work) *)work);
}

ROLN_FN roln_status C_(c_errors)(const instance *m, const roln_batch *b, roln_real dt, int every, const roln_real *qbar,
                                 const roln_errors *e, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(errors)(&p, b, dt, every, qbar, e, (C_(errors_work) *)work);
}

ROLN_FN roln_status C_(c_variance)(const instance *m, const roln_batch *b, roln_loss *var, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(variance)(&p, b, var, (C_(variance_work) *)work);
}

ROLN_FN roln_status C_(c_fit_inertia)(const instance *m, const roln_batch *b, roln_real *scale_m, void *work)
{
    C_(params) p = C_(c_params)(m);
    const roln_status st = C_(fit_inertia)(&p, b, (C_(fit_inertia_work) *)work);
    if (st == ROLN_OK || memcmp(&p.scale, m->scale, sizeof p.scale) != 0) *scale_m = p.scale.m; /* that is, if it was written */
    return st;
}

ROLN_FN roln_status C_(c_force_variance)(const instance *m, const roln_batch *b, roln_real *variance, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(force_variance)(&p, b, variance, (C_(force_variance_work) *)work);
}

ROLN_FN roln_status C_(c_grad)(const instance *m, const roln_loss *weights, const roln_batch *b, roln_real dt, void *g, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(grad)(&p, weights, b, dt, (C_(gradient) *)g, (C_(grad_work) *)work);
}

ROLN_FN roln_status C_(c_grad_acc)(const instance *m, const roln_loss *weights, const roln_batch *b, void *g, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(grad_acc)(&p, weights, b, (C_(gradient) *)g, (C_(grad_acc_work) *)work);
}

#ifdef CALLED_ROWS
ROLN_FN roln_status C_(c_rows)(const instance *m, const roln_loss *weights, const roln_batch *b, roln_real dt, uint64_t seed,
                               roln_real *J, roln_real *r, void *work)
{
    static C_(residuals) g;
    const C_(params) p = C_(c_params)(m);
    roln_real *const to = J ? g.r : g.next;
    roln_status st;
    g.seed = seed, memcpy(to, r, sizeof g.r);
    if (J) memcpy(g.J, J, sizeof g.J - C_(newton_size) * sizeof *J);
    st = C_(rows)(&p, weights, b, dt, 0, J == NULL, &g, (C_(rows_work) *)work);
    memcpy(r, to, sizeof g.r);
    if (J) memcpy(J, g.J, sizeof g.J - C_(newton_size) * sizeof *J);
    return st;
}
#endif

#ifdef CALLED_PLAN
#define CALLED_PLAN_SIZES CALLED_PLANS(CALLED_SIZE_ALONE, ROLN_NAME)
#else
#define CALLED_PLAN_SIZES
#endif
static const model C_(called) = {.name = ROLNI_STR(ROLN_NAME),
                                 .md = &C_(model),
                                 .table = C_(table),
                                 .blocks = C_(blocks),
                                 .params = C_(theta_size),
                                 .moments = C_(moment_size),
                                 .packed = C_(packed_size),
                                 .horizon = C_(horizon),
                                 .block = C_(called_block),
                                 .N = C_(N),
                                 .n = C_(n),
                                 .force_size = C_(force_size),
                                 .motors = C_(motors),
                                 .steps = C_(steps),
                                 .load = C_(load),
                                 .own = C_(own),
                                 .formed = C_(formed),
                                 .base = C_(base),
                                 .delay = C_(delay),
#ifdef CALLED_DELAY
                                 .of_ahead = (int)(sizeof(C_(ahead_work)) / sizeof(roln_real)),
#endif
                                 .scratch = {CALLED_WORK(CALLED_SIZE, ROLN_NAME) CALLED_ALONE(CALLED_SIZE_ALONE, ROLN_NAME)
                                                 CALLED_PLAN_SIZES},
                                 CALLED(CALLED_ENTRY)};

#ifdef CALLED_ALSO
#include CALLED_ALSO
#endif
#undef CALLED_PLAN_SIZES
#undef CALLED_EACH
#undef CALLED_LOAD
#undef CALLED_LEAPS
#undef CALLED_DELAY
#undef CALLED_FRICTION
#undef CALLED_PLAN
#undef CALLED_ROWS
#undef ROLN_NAME
#endif
