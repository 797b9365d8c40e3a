/* SPDX-License-Identifier: MIT */
/* units.h - two models that are one: a small model, and the same with joints in units of its own, which are powers of two. Include
   after small.h, and small_models.h of the variants `own`. */
#ifndef UNITS_H
#define UNITS_H

#define CHECK_OK(call) CHECK((call) == ROLN_OK)
#define OWN_CALLED(name) name##_own_called
static const model *const with_own[MODELS] = SMALL_TABLE(OWN_CALLED, OWN_CALLED);

/* Model k and the same with own units: of a state x of the first, x_j each_j is the same state of the second, of a force tau on it
   tau_j / each_j, unless a learned input map comes before. */
typedef struct {
    int k, N, n, F, inputs;
    instance plain, own;
    roln_real each[MAXN], theta[MAXP], low[MAXN], high[MAXN];
} pair;

ROLN_FN void pair_of(int k, uint64_t *s, pair *p)
{
    static const roln_real power[10] = {4,  ROLN_C(0.125), 2, ROLN_C(0.0625),  8, ROLN_C(0.5),
                                       16, ROLN_C(0.25), 32, ROLN_C(0.03125)};
    int i;
    p->k = k, p->N = N_OF(k), p->n = n_OF(k), p->F = F_OF(k);
    parameters(k, s, p->theta);
    for (i = 0; i < p->N; i++)
        p->each[i] = models[k]->md->lnn.angles >> i & 1 ? 1 : power[i];
    fill(MAXN, -100, p->low), fill(MAXN, 100, p->high);
    p->inputs = models[k]->md->inputs;
    p->plain = trained(models[k], scale_of(k), p->theta);
    p->plain.z_min = p->low, p->plain.z_max = p->plain.zd_max = p->high;
    p->own = p->plain, p->own.of = with_own[k], p->own.each = p->each;
}

/* y_ij = x_ij each_j^power of the rows x [rows][N]. */
ROLN_FN void in_units(const pair *p, int power, int rows, const roln_real *x, roln_real *y)
{
    int i, j;
    for (i = 0; i < rows * p->N; i++) {
        roln_real by = 1;
        for (j = 0; j < (power < 0 ? -power : power); j++)
            by *= p->each[i % p->N];
        y[i] = power < 0 ? x[i] / by : x[i] * by;
    }
}

/* Forces x [rows][F] of the plain model for the other. */
ROLN_FN void force_in_units(const pair *p, int rows, const roln_real *x, roln_real *y)
{
    if (p->inputs > 0) memcpy(y, x, (size_t)(rows * p->F) * sizeof *y);
    else in_units(p, -1, rows, x, y);
}

/* What both models make of a state [2n] and inputs u: tau_z; the inputs that lift sends for a force of the numbers zd; the state a
   step on, and its derivatives. */
typedef struct {
    roln_real tau_z[2][MAXN], lifted[2][MAXN], s[2][2 * MAXN], A[2][256], B[2][512];
} twice;

ROLN_FN void make_twice(const pair *p, const roln_real *state, roln_real (*u)[MAXN], twice *to)
{
    const int n = p->n;
    int i;
    for (i = 0; i < 2; i++) {
        const instance *m = i ? &p->own : &p->plain;
        roln_real again[2 * MAXN];
        memcpy(to->s[i], state, sizeof again), memcpy(again, state, sizeof again);
        CHECK_OK(m->of->reduce(m, state, u[i], to->tau_z[i], room_of(m->of->scratch.reduce)));
        ROOM_KEPT();
        CHECK_OK(m->of->lift(m, state, state + n, to->lifted[i], room_of(m->of->scratch.lift)));
        ROOM_KEPT();
        CHECK_OK(m->of->step(m, to->s[i], to->s[i] + n, u[i], dt / 8, room_of(m->of->scratch.step)));
        ROOM_KEPT();
        CHECK_OK(m->of->linear(m, again, again + n, u[i], dt / 8, to->A[i], to->B[i], room_of(m->of->scratch.linear)));
        ROOM_KEPT();
        CHECK(same(2 * n, again, to->s[i]) && !same(2 * n, state, again));
    }
    CHECK(largest(2 * n * p->F, to->B[0]) > 0);
}

#endif
