/* small.h - what test_roln.c and test_control.c share: a table of small models of every kind, work of exactly the promised
   size, numbers that are the same in float and in double. */
#ifndef SMALL_H
#define SMALL_H

#define ROLN_NAME ma
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#include "roln.h"

#define ROLN_NAME mb /* no autoencoder, base point, midpoint */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_STEP midpoint
#define ROLN_BASE 1
#define ROLN_HORIZON 3
#define ROLN_BLOCK 1
#include "roln.h"

#define ROLN_NAME mc /* a layer that keeps its size */
#define ROLN_AE 5, 3, 3
#define ROLN_MLP 3, 4, 3
#define ROLN_STEP euler
#define ROLN_SLOPE 0.5
#define ROLN_BASE 1
#define ROLN_BLOCK 3
#include "roln.h"

#define ROLN_NAME md /* the deepest */
#define ROLN_AE 10, 9, 8, 7, 6, 5, 4, 3, 2
#define ROLN_MLP 3, 2, 3, 2, 3
#define ROLN_SLOPE 0.625
#define ROLN_HORIZON 2
#include "roln.h"

#define ROLN_NAME me /* one degree of freedom, as linear as can be */
#define ROLN_AE 3, 1
#define ROLN_MLP 2
#define ROLN_STEP midpoint
#define ROLN_SLOPE 1
#include "roln.h"

#define ROLN_NAME mf /* everything at once */
#define ROLN_AE 6, 5, 3
#define ROLN_MLP 4, 3
#define ROLN_WIDTH 4
#define ROLN_LAYERS gyro, bimap, reeig
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#include "roln.h"

#define ROLN_NAME mg /* the Cholesky head */
#define ROLN_AE 4, 2
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_LEAST 0.0625
#define ROLN_STEP euler
#define ROLN_HORIZON 3
#include "roln.h"

#define ROLN_NAME mh /* damping, midpoint; as many inputs as joints */
#define ROLN_AE 5, 2
#define ROLN_MLP 4, 3
#define ROLN_DAMPING 1
#define ROLN_INPUTS 5
#define ROLN_STEP midpoint
#define ROLN_HORIZON 2
#define ROLN_BLOCK 5
#include "roln.h"

#define ROLN_NAME mi /* SPD layers that keep their size, no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 3
#define ROLN_LAYERS reeig, gyro, gyro, bimap
#define ROLN_LEAST 0.015625
#define ROLN_DAMPING 1
#define ROLN_HORIZON 2
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME ms /* ma, stored; not in the table below */
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#define ROLN_STORE int8
#include "roln.h"
#endif

#include "twin.h"

enum { MODELS = 9, MAXP = 1200 };
typedef struct { const roln_model *md; const roln_block *table; int blocks, params, wide, work, train, update, packed, horizon, moments, linear, block; } model;
#define MODEL(x, H, B) \
    {&x##_model, x##_table, x##_blocks, x##_theta_size, x##_wide, (int)(sizeof(x##_work) / sizeof(roln_real)), x##_grad_size, \
     x##_update_size, x##_packed_size, H, x##_moment_size, x##_linear_size, B}
static const model models[MODELS] = {MODEL(ma, 4, 16), MODEL(mb, 3, 1), MODEL(mc, 8, 3), MODEL(md, 2, 16), MODEL(me, 8, 16), MODEL(mf, 3, 16), MODEL(mg, 3, 16), MODEL(mh, 2, 5), MODEL(mi, 2, 16)};

#define N_OF(k) (models[k].md->ae.size[0])
#define n_OF(k) (models[k].md->lnn.n)
#define F_OF(k) roln_force_size(models[k].md)
/* Work of exactly n numbers, NaN at first: the eight after them must not change. */
static roln_real room[400000];
static int room_end;
ROLN_FN roln_real *work_of(int n)
{
    int i;
    for (i = 0; i < n + 8; i++) room[i] = i < n ? (roln_real)NAN : 77;
    return room + 0 * (room_end = n);
}
#define WORK_KEPT() (room[room_end] == 77 && memcmp(room + room_end, room + room_end + 1, 7 * sizeof *room) == 0)

ROLN_FN int step_work(int k, int nb)
{
    const roln_lnn *f = &models[k].md->lnn;
    return ROLN_STEP_WORK(f->n, f->width[0], f->layers, rolni_formed(f), models[k].wide, 2, nb);
}

ROLN_FN int tick_work(int k)
{
    const roln_model *m = models[k].md;
    return ROLN_TICK_WORK(N_OF(k), n_OF(k), rolni_ae_sum(&m->ae), roln_lnn_tape(&m->lnn, 2, 1), step_work(k, 1));
}

ROLN_FN int grad_work(int k, int nb, int H)
{
    const roln_model *m = models[k].md;
    return ROLN_GRAD_WORK(N_OF(k), n_OF(k), rolni_ae_sum(&m->ae), nb, H, ROLN_MAX(3, ROLN_STAGES(m->scheme)), roln_lnn_tape(&m->lnn, 2, nb),
                          step_work(k, nb));
}

ROLN_FN int linear_work(int k)
{
    const roln_model *m = models[k].md;
    return ROLN_LINEAR_WORK(N_OF(k), n_OF(k), rolni_ae_sum(&m->ae), ROLN_STAGES(m->scheme), roln_lnn_tape(&m->lnn, 2, 1), step_work(k, 1));
}

/* 16-bit dyadic numbers in +-size: the same in float and in double */
ROLN_FN void dyadic(int n, roln_real size, uint64_t *s, roln_real *x)
{
    while (n-- > 0) *x++ = size * ((roln_real)roln_randint(65536, s) - 32768) * ROLN_C(0.000030517578125);
}

/* P = I + P / 4, symmetric */
ROLN_FN void near_one(int n, roln_real *P)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) P[i * n + j] = P[j * n + i] = P[i * n + j] / 4 + (i == j);
}

/* The parameter that must move with number i, to keep a symmetric matrix symmetric; else i. */
ROLN_FN int mate(int k, int i)
{
    const roln_lnn *f = &models[k].md->lnn;
    int l, at = roln_ae_params(&models[k].md->ae) + rolni_base_at(f), w = f->width[0];
    if (f->base && i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    for (l = 0; l < f->layers; l++) {
        w = f->width[l];
        at = roln_ae_params(&models[k].md->ae) + rolni_layer_at(f, l) + ROLN_TRI(w);
        if (f->layer[l] == ROLN_GYRO && i >= at && i < at + w * w) return at + (i - at) % w * w + (i - at) / w;
    }
    return i;
}

/* Parameters: the constraint Psi^T Phi = I nearly holds, P and the biases of gyro layers are SPD, BiMap is nearly orthonormal. */
ROLN_FN void parameters(int k, uint64_t *s, roln_real *theta)
{
    const roln_model *m = models[k].md;
    const roln_lnn *f = &m->lnn;
    roln_real *P;
    int l, i, w = f->width[0];
    dyadic(models[k].params, ROLN_C(0.5), s, theta);
    for (l = 0; l < m->ae.layers; l++) {
        const int a = m->ae.size[l], b = m->ae.size[l + 1];
        for (i = 0; i < 2 * a * b; i++) theta[i] = theta[i] / 4 + (i % (a * b) / a == i % (a * b) % a);
        theta += 2 * a * b + a;
    }
    P = theta + rolni_base_at(f);
    for (i = 0; f->head == ROLN_CHOLESKY && i < f->n; i++) theta[roln_mlp_params(&f->mass) - ROLN_TRI(f->n) + i] += 1; /* L near I */
    if (f->base) near_one(w, P), P += w * w;
    for (l = 0; l < f->layers; l++) {
        const int wo = f->width[l + 1];
        w = f->width[l];
        if (f->layer[l] == ROLN_GYRO) near_one(w, P + ROLN_TRI(w)), P += ROLN_TRI(w) + w * w;
        for (i = 0; f->layer[l] == ROLN_BIMAP && i < w * wo; i++) *P = *P / 4 + (i % (w + 1) == 0), P++;
    }
}

static const roln_scale scale = {ROLN_C(2.0), ROLN_C(0.5)};
static const roln_real dt = ROLN_C(0.0625);

#ifdef ROLN_DOUBLE
#define PICK(f, d) (d)
#else
#define PICK(f, d) (f)
#endif

#endif
