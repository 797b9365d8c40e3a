/* SPDX-License-Identifier: MIT */
#include "experiment.h"
#include "solve.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Lagrangian operator inference (Sharma and Kramer, Physica D 2024), M = I: in the POD coordinates z = W^T (q - mean) the
   operators minimise |zdd + C zd + K z - f - W^T tau|^2 over all samples, all coordinates weighing the same. Double inside,
   see solve.h. */
struct opinf {
    int N, n, affine;
    struct opinf_operators of;      /* C = 0 and f = 0 where not affine                        */
    double *mean;                   /* 0 where not affine                                      */
    double h, *P;                   /* last step, NaN: none, and (I + h/2 C + h^2/4 K)^-1      */
    double *work;                   /* [2 N + 3 n]                                             */
    double *memory;                 /* of all these                                            */
};

static int fail(const char *reason)
{
    fprintf(stderr, "opinf: %s\n", reason);
    return -1;
}

void opinf_free(struct opinf *o)
{
    if (o) free(o->memory);
    free(o);
}

int opinf_fit(struct opinf **out, int affine, int n, const struct motion *train)
{
    const int N = train->N;
    const size_t Nn = (size_t)N * (size_t)n, nn = (size_t)n * (size_t)n;
    const struct opinf_data d = {N, (size_t)train->count * (size_t)train->samples, train->q, train->qd, train->qdd,
                                 train->tau ? train->tau_mid : NULL, affine ? train->mean : NULL};
    *out = NULL;
    if (n < 1 || n > N || train->count < 1 || train->samples < 1) return fail("no such sizes");
    struct opinf *o = calloc(1, sizeof *o);
    double *p = calloc(Nn + 3 * nn + 4 * (size_t)n + 3 * (size_t)N, sizeof *p);
    if (!o || !p) {
        free(o), free(p);
        return fail("out of memory");
    }
    o->N = N, o->n = n, o->affine = affine, o->h = (double)NAN;
    o->memory = o->of.W = p;
    o->of.K = p += Nn;
    o->of.C = p += nn;
    o->P = p += nn;
    o->of.f = p += nn;
    o->mean = p += n;
    o->work = p + N;
    for (int i = 0; i < N && affine; i++) o->mean[i] = (double)train->mean[i];
    if (opinf_solve(affine, n, &d, &o->of)) {
        opinf_free(o);
        return -1;
    }
    *out = o;
    return 0;
}

/* Entries of the operators; the POD basis, N n numbers (and N of the mean), comes on top. */
int opinf_params(const struct opinf *o)
{
    const int symmetric = o->n * (o->n + 1) / 2;
    return o->affine ? 2 * symmetric + o->n : symmetric;
}

/* ---- predictor: s = [z, zd] ---- */

/* z = W^T (x - mean); mean NULL: 0 */
static void project(const struct opinf *o, const roln_real *x, const double *mean, double *z)
{
    for (int k = 0; k < o->n; k++) z[k] = 0;
    for (int i = 0; i < o->N; i++)
        for (int k = 0; k < o->n; k++) z[k] += o->of.W[i * o->n + k] * ((double)x[i] - (mean ? mean[i] : 0));
}

static void lift(const struct opinf *o, const double *z, const double *mean, double *x)
{
    for (int i = 0; i < o->N; i++) {
        x[i] = mean ? mean[i] : 0;
        for (int k = 0; k < o->n; k++) x[i] += o->of.W[i * o->n + k] * z[k];
    }
}

/* F = f + W^T tau - K z - C zd; without C where zd is NULL */
static void force(const struct opinf *o, const double *z, const double *zd, const roln_real *tau, double *F)
{
    const int n = o->n;
    if (tau) project(o, tau, NULL, F);
    for (int i = 0; i < n; i++) {
        F[i] = o->of.f[i] + (tau ? F[i] : 0);
        for (int j = 0; j < n; j++) F[i] -= o->of.K[i * n + j] * z[j] + (zd ? o->of.C[i * n + j] * zd[j] : 0);
    }
}

static int fits(int n, const double *x)
{
    for (int i = 0; i < n; i++)
        if (!(fabs(x[i]) <= (double)FLT_MAX)) return 0;
    return 1;
}

static void give(int n, const double *x, roln_real *y)
{
    for (int i = 0; i < n; i++) y[i] = (roln_real)x[i];
}

static roln_status encode(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    const struct opinf *o = self;
    project(o, q, o->mean, o->work);
    project(o, qd, NULL, o->work + o->n);
    if (!fits(2 * o->n, o->work)) return ROLN_E_NOT_FINITE;
    give(2 * o->n, o->work, s);
    return ROLN_OK;
}

/* Variational midpoint rule, which for a linear system is the implicit midpoint rule: with the mean rate v
       (I + h/2 C + h^2/4 K) v = zd + h/2 (f + W^T tau - K z),   z := z + h v,   zd := 2 v - zd */
static roln_status step(void *self, roln_real *s, const roln_real *tau, double h)
{
    struct opinf *o = self;
    const int n = o->n;
    double *z = o->work, *zd = z + n, *b = zd + n;
    if (h != o->h) {
        o->h = (double)NAN;
        if (opinf_midpoint(n, h, o->of.K, o->of.C, o->P)) return ROLN_E_ILL_CONDITIONED;
        o->h = h;
    }
    for (int i = 0; i < 2 * n; i++) z[i] = (double)s[i];
    force(o, z, NULL, tau, b);
    for (int i = 0; i < n; i++) b[i] = zd[i] + h / 2 * b[i];
    for (int i = 0; i < n; i++) {
        double v = 0;
        for (int j = 0; j < n; j++) v += o->P[i * n + j] * b[j];
        z[i] += h * v;
        zd[i] = 2 * v - zd[i];
    }
    if (!fits(2 * n, z)) return ROLN_E_NOT_FINITE;
    give(2 * n, z, s);
    return ROLN_OK;
}

static roln_status decode(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    const struct opinf *o = self;
    double *z = o->work, *x = z + 2 * o->n;
    for (int i = 0; i < 2 * o->n; i++) z[i] = (double)s[i];
    lift(o, z, o->mean, x);
    lift(o, z + o->n, NULL, x + o->N);
    if (!fits(2 * o->N, x)) return ROLN_E_NOT_FINITE;
    give(o->N, x, q);
    give(o->N, x + o->N, qd);
    return ROLN_OK;
}

static roln_status accelerate(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd)
{
    const struct opinf *o = self;
    double *z = o->work, *zd = z + o->n, *zdd = zd + o->n, *x = zdd + o->n;
    project(o, q, o->mean, z);
    project(o, qd, NULL, zd);
    force(o, z, zd, tau, zdd);
    lift(o, zdd, NULL, x);
    if (!fits(o->N, x)) return ROLN_E_NOT_FINITE;
    give(o->N, x, qdd);
    return ROLN_OK;
}

/* T = |zd|^2 / 2, V = z^T K z / 2 - f^T z */
static void energy(void *self, const roln_real *s, double *T, double *V)
{
    const struct opinf *o = self;
    const int n = o->n;
    *T = *V = 0;
    for (int i = 0; i < n; i++) {
        const double z = (double)s[i], zd = (double)s[n + i];
        *T += zd * zd / 2;
        *V -= o->of.f[i] * z;
        for (int j = 0; j < n; j++) *V += z * o->of.K[i * n + j] * (double)s[j] / 2;
    }
}

struct predictor opinf_predictor(struct opinf *o)
{
    return (struct predictor){o->N, 2 * o->n, o, encode, step, decode, accelerate, energy};
}
