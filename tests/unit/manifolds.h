/* SPDX-License-Identifier: MIT */
/* manifolds.h - what test_riem.c and test_newton.c share: projections and retractions in long double, written from the formulas,
   random points, two manifolds of the user, and a table of blocks with every manifold. Include after a header of roln. */
#ifndef MANIFOLDS_H
#define MANIFOLDS_H

#include "twin.h"

#define MN 12         /* largest n, */
#define MNN (MN * MN) /* n^2, */
#define MS 512        /* and size of a block */

ROLN_FN void fill(int n, ld scale, uint64_t *s, roln_real *x)
{
    while (n-- > 0) *x++ = (roln_real)(scale * (ld)roln_normal(s));
}

/* c = op(a) op(b) for a [m][k], b [k][n]; ta, tb: stored transposed */
ROLN_FN void mul(int m, int k, int n, int ta, const ld *a, int tb, const ld *b, ld *c)
{
    int i, j, p;
    for (i = 0; i < m; i++)
        for (j = 0; j < n; j++)
            for (c[i * n + j] = 0, p = 0; p < k; p++)
                c[i * n + j] += (ta ? a[p * m + i] : a[i * k + p]) * (tb ? b[j * k + p] : b[p * n + j]);
}

ROLN_FN ld dot(int n, const ld *a, const ld *b)
{
    ld s = 0;
    while (n-- > 0) s += *a++ * *b++;
    return s;
}

ROLN_FN ld dist(int n, const roln_real *a, const ld *b)
{
    ld s = 0;
    int i;
    for (i = 0; i < n; i++) s += ((ld)a[i] - b[i]) * ((ld)a[i] - b[i]);
    return sqrtl(s);
}

/* ---- biorthogonal twins: x = (Phi^T, Psi^T) [2][n][N] ---- */

ROLN_FN void t_project(int n, int N, const ld *x, ld *u)
{
    static ld S[36 * 36], C[MNN], D[MNN], t[MS];
    const ld *phi = x, *psi = x + n * N;
    int i, j, k;
    mul(n, N, n, 0, u + n * N, 1, phi, C); /* Y^T Phi + Psi^T X */
    mul(n, N, n, 0, psi, 1, u, D);
    for (i = 0; i < n * n; i++) C[i] += D[i];
    for (i = 0; i < n * n * n * n; i++) S[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (k = 0; k < n; k++) {
                S[(i * n + j) * n * n + k * n + j] += dot(N, psi + i * N, psi + k * N);
                S[(i * n + j) * n * n + i * n + k] += dot(N, phi + k * N, phi + j * N);
            }
    t_solve(n * n, 1, S, C);
    mul(n, n, N, 1, C, 0, psi, t);
    for (i = 0; i < n * N; i++) u[i] -= t[i];
    mul(n, n, N, 0, C, 0, phi, t);
    for (i = 0; i < n * N; i++) u[n * N + i] -= t[i];
}

ROLN_FN void t_retract(int n, int N, const ld *x, const ld *u, ld *y)
{
    ld W[MNN];
    int i;
    for (i = 0; i < 2 * n * N; i++) y[i] = x[i] + u[i];
    mul(n, N, n, 0, y, 1, y + n * N, W); /* W^T */
    t_solve(n, N, W, y);
}

/* |Psi^T Phi - I|, and that over |Phi| |Psi| */
ROLN_FN ld apart(int n, int N, const roln_real *x)
{
    static ld w[MS], W[MNN];
    int i;
    widen(2 * n * N, x, w);
    mul(n, N, n, 0, w + n * N, 1, w, W);
    for (i = 0; i < n; i++) W[i * n + i] -= 1;
    return sqrtl(dot(n * n, W, W));
}

ROLN_FN ld norms(int n, int N, const roln_real *x)
{
    static ld w[MS];
    widen(2 * n * N, x, w);
    return sqrtl(dot(n * N, w, w) * dot(n * N, w + n * N, w + n * N));
}

ROLN_FN ld defect(int n, int N, const roln_real *x)
{
    return apart(n, N, x) / norms(n, N, x);
}

/* A random point; Gram eigenvalues: family 0 generic, 1 all equal to one, 2 spread over about spread^2 */
ROLN_FN void point(int n, int N, int family, uint64_t *s, roln_real *x)
{
    static ld w[MS], z[MS];
    const ld spread = PICK(1e2L, 1e4L);
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < N; j++) {
            const ld g = family == 2 && n > 1 ? powl(spread, -(ld)i / (n - 1)) : 1;
            w[i * N + j] = w[(n + i) * N + j] = family == 1 ? i == j : g * ((ld)roln_normal(s) + (i == j ? 4 : 0));
            if (family != 1) w[i * N + j] += g * 0.3L * (ld)roln_normal(s);
        }
    for (i = 0; i < 2 * n * N; i++) z[i] = 0;
    if (family != 1) t_retract(n, N, w, z, w);
    for (i = 0; i < 2 * n * N; i++) x[i] = (roln_real)w[i];
}

/* ---- SPD twins ---- */

ROLN_FN void t_chol(int n, const ld *X, ld *A)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            const ld s = j > i ? 0 : X[i * n + j] - dot(j, A + i * n, A + j * n);
            A[i * n + j] = j > i ? 0 : j < i ? s / A[j * n + j] : sqrtl(s);
        }
}

/* Y = B X B^T */
ROLN_FN void t_congruence(int n, const ld *B, const ld *X, ld *Y)
{
    ld t[MNN];
    mul(n, n, n, 0, B, 0, X, t);
    mul(n, n, n, 0, t, 1, B, Y);
}

/* X + U + 1/2 U X^-1 U */
ROLN_FN void t_spd_retract(int n, const ld *X, const ld *U, ld *Y)
{
    ld a[MNN], b[MNN];
    int i;
    memcpy(a, X, (size_t)(n * n) * sizeof *a), memcpy(b, U, (size_t)(n * n) * sizeof *b);
    t_solve(n, n, a, b);
    mul(n, n, n, 0, U, 0, b, Y);
    for (i = 0; i < n * n; i++) Y[i] = X[i] + U[i] + Y[i] / 2;
}

ROLN_FN void random_spd(int n, uint64_t *s, roln_real *X)
{
    roln_real B[MNN];
    int i;
    fill(n * n, 1, s, B);
    roln_mm_bt(n, n, n, B, B, X);
    for (i = 0; i < n; i++) X[i * n + i] += ROLN_C(0.5);
}

/* ---- Stiefel twins ---- */

/* Z - sym(Z X^T) X */
ROLN_FN void t_stiefel_project(int k, int m, const ld *X, ld *Z)
{
    static ld S[MNN], T[MNN], t[MS];
    int i, j;
    mul(k, m, k, 0, Z, 1, X, S);
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++) T[i * k + j] = (S[i * k + j] + S[j * k + i]) / 2;
    mul(k, k, m, 0, T, 0, X, t);
    for (i = 0; i < k * m; i++) Z[i] -= t[i];
}

/* Gram-Schmidt on the rows, first to last, every row twice */
ROLN_FN void t_orthonormal(int k, int m, ld *X)
{
    int i, j, p, pass;
    for (i = 0; i < k; i++)
        for (pass = 0; pass < 2; pass++) {
            ld *x = X + i * m, f;
            for (j = 0; j < i; j++)
                for (f = dot(m, x, X + j * m), p = 0; p < m; p++) x[p] -= f * X[j * m + p];
            for (f = sqrtl(dot(m, x, x)), p = 0; p < m; p++) x[p] /= f;
        }
}

/* largest |X X^T - I| */
ROLN_FN ld skewness(int k, int m, const roln_real *X)
{
    static ld x[MS];
    ld top = 0, d;
    int i, j;
    widen(k * m, X, x);
    for (i = 0; i < k; i++)
        for (j = 0; j < k; j++)
            if (!((d = fabsl(dot(m, x + i * m, x + j * m) - (i == j))) <= top)) top = d;
    return top;
}

/* ---- manifolds of the user, without a line in the header ---- */

ROLN_FN int free_size(int rows, int cols)
{
    return rows * cols;
}

ROLN_FN int no_work(int rows, int cols)
{
    (void)rows, (void)cols;
    return 0;
}

/* The unit sphere. */
ROLN_FN roln_status sphere_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm, roln_real *work)
{
    const int n = rows * cols;
    int c, i;
    (void)work;
    for (c = 0; c <= count; c++, gm += stride) {
        const roln_real f = roln_dot(n, x, gm);
        for (i = 0; i < n; i++) gm[i] -= f * x[i];
    }
    return ROLN_OK;
}

/* xn /= len, the length of xn, unless there is none or it overflows. */
ROLN_FN roln_status shorten(int n, roln_real len, roln_real *xn)
{
    int i;
    for (i = 0; i < n; i++) xn[i] /= len;
    return len > 0 && roln_finite(len) ? ROLN_OK : ROLN_E_ILL_CONDITIONED;
}

ROLN_FN roln_status sphere_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    const int n = rows * cols;
    int i;
    (void)work;
    for (i = 0; i < n; i++) xn[i] = x[i] + u[i];
    return shorten(n, ROLN_SQRT(roln_dot(n, xn, xn)), xn);
}

ROLNI_TABLE roln_manifold sphere = {free_size, no_work, sphere_tangent, NULL, sphere_retract};

/* Shapes of unit modal mass, x^T M x = 1, in the metric of the masses: an inner product of its own. */
enum { MASSES = 4 };
static const roln_real mass[MASSES] = {1, 3, ROLN_C(0.5), 2};

ROLN_FN roln_real mode_inner(int rows, int cols, const roln_real *x, const roln_real *u, const roln_real *v)
{
    roln_real sum = 0;
    int i;
    (void)x;
    for (i = 0; i < rows * cols; i++) sum += u[i] * mass[i] * v[i];
    return sum;
}

ROLN_FN roln_status mode_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm, roln_real *work)
{
    const int n = rows * cols;
    int c, i;
    (void)work;
    for (c = 0; c <= count; c++, gm += stride) {
        const roln_real f = c < count ? roln_dot(n, x, gm) : mode_inner(rows, cols, x, x, gm);
        for (i = 0; i < n; i++) gm[i] = (c < count ? gm[i] / mass[i] : gm[i]) - f * x[i];
    }
    return ROLN_OK;
}

ROLN_FN roln_status mode_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    const int n = rows * cols;
    int i;
    (void)work;
    for (i = 0; i < n; i++) xn[i] = x[i] + u[i];
    return shorten(n, ROLN_SQRT(mode_inner(rows, cols, x, xn, xn)), xn);
}

ROLNI_TABLE roln_manifold mode = {free_size, no_work, mode_tangent, mode_inner, mode_retract};

/* ---- a table of every manifold, empty blocks too ---- */

enum { BLOCKS = 12, AT_B = 6, AT_S = 26, AT_E = 35, AT_B2 = 39, AT_T = 51, AT_U = 59, SIZE = 62, MOMENTS = 15 };
static const roln_block table[BLOCKS] = {{ROLN_EUCLIDEAN, 2, 3, 0},   {&roln_spd, 0, 0, 0},      {&roln_biorthogonal, 2, 5, 1},
                                         {&roln_biorthogonal, 0, 0, 1}, {&roln_spd, 3, 3, 0},      {ROLN_EUCLIDEAN, 1, 0, 1},
                                         {ROLN_EUCLIDEAN, 4, 1, 1},    {&roln_biorthogonal, 2, 3, 0},
                                         {&roln_stiefel, 2, 4, 1},     {&roln_stiefel, 0, 0, 0}, {&sphere, 3, 0, 1},
                                         {&sphere, 1, 3, 0}};

/* A random point of the table's product. */
ROLN_FN void point_of_table(uint64_t *s, roln_real *x)
{
    roln_real work[ROLN_STIEFEL_INIT_WORK(2)];
    fill(6, 1, s, x);
    point(2, 5, 0, s, x + AT_B);
    random_spd(3, s, x + AT_S);
    fill(4, 1, s, x + AT_E);
    point(2, 3, 0, s, x + AT_B2);
    CHECK(roln_stiefel_init(2, 4, x + AT_T, s, work) == ROLN_OK);
    CHECK(roln_stiefel_init(1, 3, x + AT_U, s, work) == ROLN_OK);
}

#endif
