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

#endif
