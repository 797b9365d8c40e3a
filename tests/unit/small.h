/* SPDX-License-Identifier: MIT */
/* small.h - what the tests of roln.h share: a table of small models of every kind, parameters that lie on their manifolds, numbers
   that are the same in float and in double. Before it: CALLED(X), the functions that the file calls (called.h). */
#ifndef SMALL_H
#define SMALL_H

#include "small_models.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME stored /* plain with weights of eight bits; not in the table below */
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#define ROLN_QUANTISE int8
#include "roln.h"
#endif

#include "twin.h"
#include "room.h"
#include "numbers.h"

/* ---- the table -------------------------------------------------------------------------------- */

#ifdef OF_ACTUATORS
enum { CURRENT, SERVO, WINCH, MODELS };
#define SMALL_TABLE(X, Y) {&X(current), &X(servo), &X(winch)}
#elif defined OF_DRIVEN
enum { CART, HELD, CABLE, TIED, MODELS };
#define SMALL_TABLE(X, Y) {&X(cart), &X(held), &X(cable), &X(tied)}
#else
enum { PLAIN, BARE, SQUARE, DEEP, POLE, RICH, DELAN, PUSHED, LAYERED, CHART, CURVED, WHEEL, LADEN, RUBBED, BOWL, GANTRY, MODELS };
/* X(name) of every model, of those with learned inputs Y(name) */
#define SMALL_TABLE(X, Y) \
    {&X(plain), &X(bare), &X(square), &X(deep), &X(pole), &Y(rich), &X(delan), &Y(pushed), &X(layered), &X(chart), &Y(curved), \
     &X(wheel), &X(laden), &X(rubbed), &X(bowl), &X(gantry)}
#endif
#define SMALL_CALLED(name) name##_called
static const model *const models[MODELS] = SMALL_TABLE(SMALL_CALLED, SMALL_CALLED);

#define N_OF(k) (models[k]->N)
#define n_OF(k) (models[k]->n)
#define F_OF(k) (models[k]->force_size)

/* ---- a model with its numbers ----------------------------------------------------------------- */

enum { MAXP = 1200, MAXN = 16 }; /* parameters, numbers of a vector */

static const roln_scale scale = {ROLN_C(2.0), ROLN_C(0.5), 1}, with_angles = {1, ROLN_C(0.5), 1}, unit = {1, 1, 1};
static const roln_real dt = ROLN_C(0.0625);

ROLN_FN const roln_scale *scale_of(int k)
{
    return models[k]->md->lnn.angles ? &with_angles : &scale;
}

/* A model with its numbers, without a range. */
ROLN_FN instance trained(const model *of, const roln_scale *sc, const roln_real *theta)
{
    const instance m = {of, sc, NULL, NULL, NULL, theta, NULL};
    return m;
}

/* ---- scratch ---------------------------------------------------------------------------------- */

/* Room of one function of model k, which has to be there. */
#define ROOM(function) room_of(models[k]->scratch.function)

static roln_real spare[20000] __attribute__((__unused__)); /* where scratch is not what is tested */

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
    const roln_lnn *f = &models[k]->md->lnn;
    const int w = f->n;
    int l, at = roln_ae_params(&models[k]->md->ae) + rolni_base_at(f);
    if (f->base && i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    for (l = 0; l < f->layers; l++) {
        at = roln_ae_params(&models[k]->md->ae) + rolni_layer_at(f, l) + ROLN_TRI(w);
        if (i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    }
    return i;
}

/* The layer of a chart keeps its last numbers, times 1/2, 1, 2 ..: columns of Phi and W, rows of Psi. */
ROLN_FN void keep_numbers(const roln_ae *shape, roln_real *phi)
{
    const int N = shape->size[0], n = shape->size[1];
    roln_real *const psi = phi + n * N, *const W = psi + (n + 1) * N, factor = ROLN_C(0.5);
    int i, j;
    for (j = N - shape->keeps; j < N; j++, factor *= 2) {
        for (i = 0; i < n; i++) phi[i * N + j] = j - N == i - n ? 1 / factor : 0;
        for (i = 0; i < N; i++) psi[(n - N + j) * N + i] = i == j ? factor : 0;
        for (i = 0; i < shape->monomials; i++) W[i * N + j] = 0;
    }
}

/* Weights W of polynomials become small, since the polynomials grow outside of [-1, 1]; those of networks stay. */
ROLN_FN void calm(const roln_mlp *f, roln_real *W)
{
    int i;
    for (i = 0; f->degree > 0 && i < f->size[1] * f->size[2]; i++)
        W[i] /= i % f->size[1] < f->size[0] ? 2 : 16;
}

/* Parameters: the constraint Psi^T Phi = I nearly holds, P and the biases of gyro layers are SPD. */
ROLN_FN void parameters(int k, uint64_t *s, roln_real *theta)
{
    const roln_model *m = models[k]->md;
    const roln_lnn *f = &m->lnn;
    static const roln_real little[6] = {-2, 1, -3, 2, -3, 0};
    const int w = f->n, hidden = f->damper_net.size[f->damper_net.layers - 1];
    roln_real *P;
    int l, i;
    dyadic(models[k]->params, ROLN_C(0.5), s, theta);
    for (l = 0; l < m->ae.layers; l++) {
        const int a = m->ae.size[l], b = m->ae.size[l + 1];
        for (i = 0; i < 2 * a * b; i++)
            theta[i] = theta[i] / 4 + (i % (a * b) / a == i % (a * b) % a);
        if (m->ae.keeps > 0) keep_numbers(&m->ae, theta);
        theta += 2 * a * b + a;
    }
    theta += m->ae.monomials * roln_ae_bent(&m->ae);
    P = theta + rolni_base_at(f);
    calm(&f->mass_net, theta), calm(&f->potential_net, theta + rolni_potential_at(f));
    if (f->damping) calm(&f->damper_net, theta + rolni_damper_at(f));
    for (i = 0; f->mass == ROLN_CHOLESKY && i < f->n; i++) /* L near I */
        theta[roln_mlp_params(&f->mass_net) - rolni_outputs(f) + i * (f->squares + 1)] += 1;
    for (i = 0; i < ROLNI_LAW(f->friction) * f->n; i++) /* little, and not sharp: midpoint converges */
        theta[rolni_friction_at(f) + i] += little[i / f->n];
    for (i = 0; f->damping > 1 && i < w * w; i++) { /* W little, too: zd is large where feedback is tested */
        roln_real *bias = theta + rolni_friction_at(f) - w * w, *weights = bias - ROLN_TRI(w) - w * w * hidden;
        bias[i] /= 8;
        for (l = 0; l < hidden; l++) weights[i * hidden + l] /= 8;
    }
    if (f->base) near_one(w, P), P += w * w;
    for (l = 0; l < f->layers; l++, P += w * w) P += ROLN_TRI(w), near_one(w, P);
}

#endif
