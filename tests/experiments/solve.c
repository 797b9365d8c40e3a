/* SPDX-License-Identifier: MIT */
#define ROLN_DOUBLE
#include "solve.h"

#include <float.h>
#include <stdio.h>
#include <stdlib.h>

#include "roln_spd.h"

enum { CHUNK = 64, ITERATIONS = 1000000 };
static const double tolerance = 1e-6;       /* bound of the error of the operators, relative to those without the cone */
static const double condition = 1e7;        /* largest of the Hessian: beyond it the bound drowns in rounding */

static int fail(const char *reason)
{
    fprintf(stderr, "%s\n", reason);
    return -1;
}

static double *numbers(size_t count)
{
    return calloc(count, sizeof(double));
}

/* ---- moments ---- */

/* X = x - y of a chunk of rows; y has the given stride, 0: one row for all; NULL: 0 */
static void load(int rows, int N, const float *x, const float *y, int stride, double *X)
{
    for (int i = 0; i < rows; i++)
        for (int j = 0; j < N; j++)
            X[i * N + j] = (double)x[i * N + j] - (y ? (double)y[i * stride + j] : 0);
}

static int chunk(const struct opinf_data *d, size_t at)
{
    return d->rows - at < CHUNK ? (int)(d->rows - at) : CHUNK;
}

/* The n leading eigenvectors of sum (q - mean)(q - mean)^T. roln_eig in double finds all N of them, whatever the gaps
   between the eigenvalues are, on which a subspace iteration depends. */
int pod_solve(int N, size_t rows, const float *q, const float *mean, int n, double *W)
{
    const size_t NN = (size_t)N * (size_t)N;
    double *S = numbers(NN + (3 + CHUNK) * (size_t)N), *l = S ? S + NN : NULL, *X = S ? l + 3 * N : NULL;
    if (!S) return fail("out of memory");
    for (size_t at = 0; at < rows; at += CHUNK) {
        const int now = rows - at < CHUNK ? (int)(rows - at) : CHUNK;
        load(now, N, q + at * (size_t)N, mean, 0, X);
        roln_mm_at(N, now, N, X, X, S);
    }
    const roln_status st = roln_eig(N, S, l, S, l + N);
    for (int i = 0; i < N && st == ROLN_OK; i++)
        for (int k = 0; k < n; k++) W[i * n + k] = S[(N - 1 - k) * N + i];
    free(S);
    return st == ROLN_OK ? 0 : fail("no POD: are the data finite?");
}

/* Rows r = [z, zd, a] (without C: [z, a]) with a = zdd - W^T tau: M = mean of r r^T, s = mean of r. */
static void moments(int n, int blocks, const struct opinf_data *d, const double *W, double *X, double *R, double *M, double *s)
{
    const int N = d->N, width = (blocks + 1) * n;
    for (size_t at = 0; at < d->rows; at += CHUNK) {
        const int rows = chunk(d, at);
        const size_t first = at * (size_t)N;
        double *Z = R + CHUNK * width;
        for (int b = 0; b <= blocks; b++) {
            if (b == 0) load(rows, N, d->q + first, d->mean, 0, X);
            else if (b < blocks) load(rows, N, d->qd + first, NULL, 0, X);
            else load(rows, N, d->qdd + first, d->tau ? d->tau + first : NULL, N, X);
            roln_mm(rows, N, n, X, W, Z);
            for (int i = 0; i < rows; i++)
                for (int k = 0; k < n; k++) {
                    R[i * width + b * n + k] = Z[i * n + k];
                    s[b * n + k] += Z[i * n + k];
                }
        }
        roln_mm_at(width, rows, width, R, R, M);
    }
    for (int i = 0; i < width * width; i++) M[i] /= (double)d->rows;
    for (int i = 0; i < width; i++) s[i] /= (double)d->rows;
}

/* ---- least squares over the cone ---- */

/* Symmetric X as a vector x whose dot product is <X, X>: off the diagonal times sqrt 2. */
static void pack(int n, const double *X, double *x)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++) *x++ = i == j ? X[i * n + i] : sqrt(.5) * (X[i * n + j] + X[j * n + i]);
}

static void unpack(int n, const double *x, double *X)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++, x++) X[i * n + j] = X[j * n + i] = i == j ? *x : sqrt(.5) * *x;
}

/* x := the nearest positive semi-definite matrices: negative eigenvalues become 0. work [2 n^2 + 3 n] */
static roln_status clip(int n, int blocks, double *x, double *work)
{
    double *X = work, *Q = X + n * n, *l = Q + n * n;
    for (int b = 0; b < blocks; b++, x += n * (n + 1) / 2) {
        unpack(n, x, X);
        const roln_status st = roln_eig(n, X, l, Q, l + n);
        if (st != ROLN_OK) return st;
        memset(X, 0, (size_t)(n * n) * sizeof *X);
        for (int k = 0; k < n; k++)
            for (int i = 0; i < n && l[k] > 0; i++)
                for (int j = 0; j < n; j++) X[i * n + j] += l[k] * Q[k * n + i] * Q[k * n + j];
        pack(n, X, x);
    }
    return ROLN_OK;
}

/* min x^T H x / 2 + g^T x over the cone: projected gradient with the momentum of a strongly convex function (Nesterov 2004,
   2.2.4), from the clipped minimiser without the cone, which is the answer where nothing is clipped. l, Q: eigenvalues
   (ascending) and eigenvectors of H, which give that minimiser as well as L and mu. Stopping rule: of the fixed-point residual
   r = y - P(y - (H y + g) / L) follows |y - x*| <= 2 L / mu |r| (Pang 1987). */
static int descend(int n, int blocks, int d, const double *H, const double *g, const double *l, const double *Q, double *x,
                   double *work)
{
    const double L = l[d - 1], mu = l[0], root = sqrt(mu / L), beta = (1 - root) / (1 + root);
    double *y = work, *next = y + d, *eig = next + d, size = 0;
    memset(x, 0, (size_t)d * sizeof *x);
    for (int k = 0; k < d; k++) {
        const double c = -roln_dot(d, Q + k * d, g) / l[k];
        size += c * c;
        for (int i = 0; i < d; i++) x[i] += c * Q[k * d + i];
    }
    if (clip(n, blocks, x, eig) != ROLN_OK) return fail("no eigenvalues");
    memcpy(y, x, (size_t)d * sizeof *y);
    for (int t = 0; t < ITERATIONS; t++) {
        double r = 0;
        for (int i = 0; i < d; i++) next[i] = y[i] - (roln_dot(d, H + i * d, y) + g[i]) / L;
        if (clip(n, blocks, next, eig) != ROLN_OK) return fail("no eigenvalues");
        for (int i = 0; i < d; i++) {
            r += (y[i] - next[i]) * (y[i] - next[i]);
            y[i] = next[i] + beta * (next[i] - x[i]);
            x[i] = next[i];
        }
        if (2 * L / mu * sqrt(r) <= tolerance * sqrt(size)) return 0;
    }
    return fail("projected gradient does not converge");
}

/* T = block (b, c) of M */
static void block(int n, int width, const double *M, int b, int c, double *T)
{
    for (int i = 0; i < n; i++) memcpy(T + i * n, M + (b * n + i) * width + c * n, (size_t)n * sizeof *T);
}

/* S = G^-1/4. work [n^2 + 3 n] */
static roln_status quarter_root(int n, const double *G, double *S, double *work)
{
    double *Q = work, *l = Q + n * n;
    const roln_status st = roln_eig(n, G, l, Q, l + n);
    if (st != ROLN_OK) return st;
    if (!(l[0] > (double)FLT_EPSILON * (double)FLT_EPSILON * l[n - 1])) return ROLN_E_ILL_CONDITIONED;  /* float's rounding */
    memset(S, 0, (size_t)(n * n) * sizeof *S);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) S[i * n + j] += Q[k * n + i] * Q[k * n + j] / sqrt(sqrt(l[k]));
    return ROLN_OK;
}

/* H of X -> sym(P X G), one block of the Hessian, on packed X; H has rows of d */
static void hessian(int n, int d, const double *P, const double *G, double *H)
{
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++, H += d)
            for (int k = 0, v = 0; k < n; k++)
                for (int m = 0; m <= k; m++, v++)
                    H[v] = (i == j ? .5 : sqrt(.5)) * (k == m ? .5 : sqrt(.5))
                        * (P[i * n + k] * G[m * n + j] + P[i * n + m] * G[k * n + j]
                           + P[j * n + k] * G[m * n + i] + P[j * n + m] * G[k * n + i]);
}

/* Symmetric positive semi-definite X_0 = K (and X_1 = C) minimise the mean of |a + K z (+ C zd)|^2 / 2, of gradient
   sym(sum_b X_b G_bc + A_c) with the blocks G and A of M. Solved for X' = S^-1 X S^-1, S_b = G_bb^-1/4: a congruence maps the
   cone onto itself, and of K alone the Hessian then has the condition sqrt(k) / 2 where G has k.
       Hessian  X' -> sym(sum_b S_c S_b X'_b (S_b G_bc S_c)),  gradient at 0  sym(S_c A_c S_c) */
static int cone(int n, int blocks, const double *M, double *K, double *C)
{
    const int width = (blocks + 1) * n, m = n * (n + 1) / 2, d = blocks * m, nn = n * n;
    const size_t dd = (size_t)d * (size_t)d;
    double *H = numbers(2 * dd + 7 * (size_t)d + 7 * (size_t)nn + 3 * (size_t)n);
    if (!H) return fail("out of memory");
    double *Q = H + dd, *g = Q + dd, *l = g + d, *x = l + d, *S = x + d, *T = S + 2 * nn, *G = T + nn, *P = G + nn;
    double *work = P + nn;                  /* [4 d + 2 n^2 + 3 n], of descend */
    double *out[2] = {K, C};
    roln_status st = ROLN_OK;
    for (int b = 0; b < blocks && st == ROLN_OK; b++) {
        block(n, width, M, b, b, G);
        st = quarter_root(n, G, S + b * nn, work);
    }
    for (int c = 0; c < blocks && st == ROLN_OK; c++) {
        block(n, width, M, blocks, c, G);
        roln_mm(n, n, n, S + c * nn, G, T);
        roln_mm(n, n, n, T, S + c * nn, G);
        pack(n, G, g + c * m);
        for (int b = 0; b < blocks; b++) {
            block(n, width, M, b, c, G);
            roln_mm(n, n, n, S + b * nn, G, T);
            roln_mm(n, n, n, T, S + c * nn, G);
            roln_mm(n, n, n, S + c * nn, S + b * nn, P);
            hessian(n, d, P, G, H + c * m * d + b * m);
        }
    }
    if (st == ROLN_OK) st = roln_eig(d, H, l, Q, work);
    int status = st == ROLN_OK && l[0] * condition > l[d - 1] ? 0 : fail("the data do not determine the operators");
    if (status == 0) status = descend(n, blocks, d, H, g, l, Q, x, work);
    for (int b = 0; b < blocks && status == 0; b++) {
        unpack(n, x + b * m, G);
        roln_mm(n, n, n, S + b * nn, G, T);
        roln_mm(n, n, n, T, S + b * nn, out[b]);
    }
    free(H);
    return status;
}

int opinf_solve(int affine, int n, const struct opinf_data *d, struct opinf_operators *o)
{
    const int blocks = affine ? 2 : 1, width = (blocks + 1) * n;
    const size_t chunks = CHUNK * ((size_t)d->N + (size_t)(width + n)), ww = (size_t)width * (size_t)width;
    double *X = numbers(chunks + ww + (size_t)width);
    if (!X) return fail("out of memory");
    double *M = X + chunks, *s = M + ww;
    int status = pod_solve(d->N, d->rows, d->q, d->mean, n, o->W);
    if (status == 0) moments(n, blocks, d, o->W, X, X + CHUNK * d->N, M, s);
    if (status == 0 && !roln_all_finite((width + 1) * width, M)) status = fail("data are not finite");
    /* the minimiser over f is the mean of a + C zd + K z: K and C are those of the centred data */
    for (int i = 0; i < width * width && affine; i++) M[i] -= s[i / width] * s[i % width];
    memset(o->C, 0, (size_t)(n * n) * sizeof *o->C);
    memset(o->f, 0, (size_t)n * sizeof *o->f);
    if (status == 0) status = cone(n, blocks, M, o->K, o->C);
    for (int i = 0; i < n && affine; i++)
        o->f[i] = s[2 * n + i] + roln_dot(n, o->K + i * n, s) + roln_dot(n, o->C + i * n, s + n);
    free(X);
    return status;
}

/* ---- time step ---- */

int opinf_midpoint(int n, double h, const double *K, const double *C, double *P)
{
    double *work = numbers(2 * (size_t)n * (size_t)n), *A = work ? work + n * n : NULL;
    if (!work) return fail("out of memory");
    for (int i = 0; i < n * n; i++) A[i] = (i % (n + 1) == 0) + h / 2 * C[i] + h * h / 4 * K[i];
    const roln_status st = roln_inv(n, A, P, work);
    free(work);
    return st == ROLN_OK ? 0 : -1;
}
