/* SPDX-License-Identifier: MIT */
/* small.h - what test_roln.c and test_control.c share: a table of small models of every kind with all their sizes, parameters that
   lie on their manifolds, numbers that are the same in float and in double. */
#ifndef SMALL_H
#define SMALL_H

#define ROLN_NAME plain
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME bare /* no autoencoder; base point, midpoint */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_STEP midpoint
#define ROLN_BASE 1
#define ROLN_HORIZON 3
#define ROLN_BLOCK 1
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME square /* a layer that keeps its size */
#define ROLN_AE 5, 3, 3
#define ROLN_MLP 3, 4, 3
#define ROLN_STEP euler
#define ROLN_SLOPE 0.5
#define ROLN_BASE 1
#define ROLN_BLOCK 3
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME deep /* the deepest */
#define ROLN_AE 10, 9, 8, 7, 6, 5, 4, 3, 2
#define ROLN_MLP 3, 2, 3, 2, 3
#define ROLN_SLOPE 0.625
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME pole /* one degree of freedom, as linear as can be */
#define ROLN_AE 3, 1
#define ROLN_MLP 2
#define ROLN_STEP midpoint
#define ROLN_SLOPE 1
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME rich /* everything at once */
#define ROLN_AE 6, 5, 3
#define ROLN_MLP 4, 3
#define ROLN_LAYERS gyro
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME delan /* the mass matrix L L^T + least I of DeLaN */
#define ROLN_AE 4, 2
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_LEAST 0.0625
#define ROLN_STEP euler
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME pushed /* damping, midpoint; as many inputs as joints */
#define ROLN_AE 5, 2
#define ROLN_MLP 4, 3
#define ROLN_DAMPING 1
#define ROLN_INPUTS 5
#define ROLN_STEP midpoint
#define ROLN_HORIZON 2
#define ROLN_BLOCK 5
#define ROLN_PLAN 4, 5
#include "roln.h"

#define ROLN_NAME layered /* as many SPD layers as there may be, no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 3
#define ROLN_LAYERS gyro, gyro, gyro, gyro
#define ROLN_DAMPING 1
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME chart /* a chart of polynomials, and nothing else in the autoencoder */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 3
#define ROLN_HORIZON 3
#define ROLN_BLOCK 4
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME curved /* a chart behind a layer with an activation; inputs, midpoint */
#define ROLN_AE 6, 4, 3
#define ROLN_MLP 4, 3
#define ROLN_SLOPE 0.5
#define ROLN_CHART polynomial, 2
#define ROLN_STEP midpoint
#define ROLN_INPUTS 2
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME wheel /* two angles and a slider between them, dry friction */
#define ROLN_AE 3
#define ROLN_MLP 4, 5
#define ROLN_ANGLES 1, 0, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#include "roln.h"

#define ROLN_NAME laden /* its filter estimates a load */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_LOAD 1
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME stored /* plain with weights of eight bits; not in the table below */
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#define ROLN_STORE int8
#include "roln.h"
#endif

#include "twin.h"
#include "room.h"

/* ---- the table -------------------------------------------------------------------------------- */

/* Every size that the work macros ask for, as the shell makes them: NAME_N, NAME_n .. */
#define SIZES(X, of) \
    X(of, N) X(of, N1) X(of, N2) X(of, n) X(of, ae_sum) X(of, curves) X(of, bent) X(of, ae_size) X(of, inputs) X(of, own) \
    X(of, force_size) X(of, scheme) X(of, base) X(of, damping) X(of, cossin) X(of, cholesky) X(of, formed) \
    X(of, hidden) X(of, wide) X(of, layers) X(of, row_mass) X(of, row_gradient) X(of, row_dm) X(of, row_bwd_0) X(of, row_bwd_1) \
    X(of, row_bwd_2) X(of, row_jac_1) X(of, row_jac_2) \
    X(of, step_kept) X(of, step_bwd) X(of, mid_kept) X(of, mid_bwd) X(of, start_kept) X(of, start_bwd) X(of, step_once) \
    X(of, mid_once) X(of, start_once) X(of, stage_kept) X(of, stage_bwd) X(of, inverse_kept) X(of, inverse_bwd) \
    X(of, steps) X(of, motors) X(of, load) X(of, state_work) X(of, load_work)
#define SIZE_FIELD(of, name) int name;
#define SIZE_VALUE(of, name) of##_##name,
typedef struct {
    SIZES(SIZE_FIELD, )
} sizes;

/* Every function with scratch, and the union that has a member of its name. */
#define MEMBERS(X, of) \
    X(of, work, encode) X(of, work, aim) X(of, work, decode) X(of, work, decode_some) X(of, work, step) X(of, work, reduce) \
    X(of, work, lift) X(of, work, terms) X(of, work, inverse) X(of, work, inertia) X(of, work, control) X(of, work, allocate) \
    X(of, work, gains) X(of, work, guard_tick) X(of, work, tick) X(of, work, fit_range) X(of, train, fit_limits) \
    X(of, train, fit_noise) X(of, linwork, linear) X(of, lqrwork, lqr) X(of, lqrwork, lqr_along) \
    X(of, filterwork, filter_tick) X(of, planwork, plan_next) X(of, planwork, plan_linear) X(of, train, grad) \
    X(of, train, grad_acc) X(of, train, update) X(of, train, variance) X(of, train, fit_inertia) \
    X(of, train, errors) X(of, start, init)
#define NUMBERS_OF(type, member) ((int)(sizeof(((type *)0)->member) / sizeof(roln_real)))
#define MEMBER_FIELD(of, type, name) int name;
#define MEMBER_VALUE(of, type, name) NUMBERS_OF(of##_##type, name),
typedef struct {
    MEMBERS(MEMBER_FIELD, )
} members;

typedef struct {
    const char *name;
    const roln_model *md;
    const roln_block *table;
    int blocks, params, moments, packed, horizon, block;
    sizes size;
    members scratch;
} model;

enum { PLAIN, BARE, SQUARE, DEEP, POLE, RICH, DELAN, PUSHED, LAYERED, CHART, CURVED, WHEEL, LADEN, MODELS };
#define MODEL(of, block) \
    {#of, \
     &of##_model, \
     of##_table, \
     of##_blocks, \
     of##_theta_size, \
     of##_moment_size, \
     of##_packed_size, \
     of##_horizon, \
     block, \
     {SIZES(SIZE_VALUE, of)}, \
     {MEMBERS(MEMBER_VALUE, of)}}
static const model models[MODELS] = {
    MODEL(plain, 16), MODEL(bare, 1), MODEL(square, 3), MODEL(deep, 16), MODEL(pole, 16), MODEL(rich, 16), MODEL(delan, 16),
    MODEL(pushed, 5), MODEL(layered, 16), MODEL(chart, 4), MODEL(curved, 16), MODEL(wheel, 16), MODEL(laden, 16),
};

#define N_OF(k) (models[k].size.N)
#define n_OF(k) (models[k].size.n)
#define F_OF(k) (models[k].size.force_size)

/* ---- a model with its numbers ----------------------------------------------------------------- */

enum { MAXP = 1200, MAXN = 16 }; /* parameters, numbers of a vector */

static const roln_scale scale = {ROLN_C(2.0), ROLN_C(0.5), 1}, with_angles = {1, ROLN_C(0.5), 1}, unit = {1, 1, 1};
static const roln_real dt = ROLN_C(0.0625);

ROLN_FN const roln_scale *scale_of(int k)
{
    return models[k].md->lnn.angles ? &with_angles : &scale;
}

ROLN_FN roln_trained trained(const roln_model *md, const roln_scale *sc, const roln_real *theta)
{
    const roln_trained m = {md, sc, NULL, NULL, NULL, theta, NULL};
    return m;
}

/* ---- scratch ---------------------------------------------------------------------------------- */

/* The room of the function that was called last has not been left. */
#define ROOM_KEPT() CHECK_BELOW(room_used(), room_end)

/* Room of one function of model k, which has to be there. */
#define ROOM(function) room_of(models[k].scratch.function)

static roln_real spare[20000]; /* where scratch is not what is tested */

/* Sizes of training in blocks of nb windows of H steps. */
ROLN_FN sizes for_block(int k, int nb)
{
    sizes z = models[k].size;
#define OF_Z(name) z.name
#define SET_SIZE(name, size) z.name = (size);
    ROLN_GRAD_STEPS(SET_SIZE, OF_Z, nb)
#undef SET_SIZE
    return z;
}

ROLN_FN int grad_work(int k, int nb, int H)
{
    const sizes z = for_block(k, nb);
    return ROLN_GRAD_WORK(OF_Z, nb, H);
}

ROLN_FN int grad_acc_work(int k, int nb)
{
    const sizes z = for_block(k, nb);
    return ROLN_GRAD_ACC_WORK(OF_Z, nb);
}

ROLN_FN int errors_work(int k, int nb)
{
    const sizes z = for_block(k, nb);
    return ROLN_ERRORS_WORK(OF_Z, nb);
}

/* ---- numbers ---------------------------------------------------------------------------------- */

/* 16-bit dyadic numbers in +-size: the same in float and in double */
ROLN_FN void dyadic(int n, roln_real size, uint64_t *s, roln_real *x)
{
    while (n-- > 0)
        *x++ = size * ((roln_real)roln_randint(65536, s) - 32768) * ROLN_C(0.000030517578125);
}

ROLN_FN void fill(int n, roln_real value, roln_real *x)
{
    while (n-- > 0)
        *x++ = value;
}

/* Are the n numbers at x all `value`, which is not NaN? */
ROLN_FN int all(int n, const roln_real *x, roln_real value)
{
    int i, ok = 1;
    for (i = 0; i < n; i++)
        ok &= x[i] <= value && x[i] >= value;
    return ok;
}

ROLN_FN ld largest(int n, const roln_real *x)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl((ld)x[i]) > top ? fabsl((ld)x[i]) : top;
    return top;
}

ROLN_FN ld furthest(int n, const roln_real *x, const roln_real *y)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl((ld)x[i] - (ld)y[i]) > top ? fabsl((ld)x[i] - (ld)y[i]) : top;
    return top;
}

/* P = I + P / 4, symmetric */
ROLN_FN void near_one(int n, roln_real *P)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++)
            P[i * n + j] = P[j * n + i] = P[i * n + j] / 4 + (i == j);
}

/* The parameter that must move with number i, to keep a symmetric matrix symmetric; else i. */
ROLN_FN int mate(int k, int i)
{
    const roln_lnn *f = &models[k].md->lnn;
    const int w = f->n;
    int l, at = roln_ae_params(&models[k].md->ae) + rolni_base_at(f);
    if (f->base && i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    for (l = 0; l < f->layers; l++) {
        at = roln_ae_params(&models[k].md->ae) + rolni_layer_at(f, l) + ROLN_TRI(w);
        if (i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    }
    return i;
}

/* Parameters: the constraint Psi^T Phi = I nearly holds, P and the biases of gyro layers are SPD. */
ROLN_FN void parameters(int k, uint64_t *s, roln_real *theta)
{
    const roln_model *m = models[k].md;
    const roln_lnn *f = &m->lnn;
    const int w = f->n;
    roln_real *P;
    int l, i;
    dyadic(models[k].params, ROLN_C(0.5), s, theta);
    for (l = 0; l < m->ae.layers; l++) {
        const int a = m->ae.size[l], b = m->ae.size[l + 1];
        for (i = 0; i < 2 * a * b; i++)
            theta[i] = theta[i] / 4 + (i % (a * b) / a == i % (a * b) % a);
        theta += 2 * a * b + a;
    }
    theta += m->ae.curves * roln_ae_bent(&m->ae);
    P = theta + rolni_base_at(f);
    for (i = 0; f->mass == ROLN_CHOLESKY && i < f->n; i++) /* L near I */
        theta[roln_mlp_params(&f->mass_net) - ROLN_TRI(f->n) + i] += 1;
    for (i = 0; f->friction && i < f->n; i++) /* little, and not sharp: midpoint converges */
        theta[rolni_friction_at(f) + i] -= 2, theta[rolni_friction_at(f) + f->n + i] += 1;
    if (f->base) near_one(w, P), P += w * w;
    for (l = 0; l < f->layers; l++, P += w * w) P += ROLN_TRI(w), near_one(w, P);
}

#endif
