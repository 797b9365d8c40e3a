/* SPDX-License-Identifier: MIT */
/* Manifolds and optimisers (roln_riem.h) against twins in long double, written from the formulas: projections by one
   linear system in the n^2 unknowns of A, SPD tangents as full matrices, Adam step by step. */
#include "roln_riem.h"
#include "manifolds.h"
#include "room.h"

#include <stdlib.h>

void TEST_NAME(riem)(void);

static ld worst[19]; /* measured errors, in units of the bounds' eps */
#define WORST(k, e, bound) (worst[k] = (e) > worst[k] ? (e) : worst[k], CHECK_BELOW(e, bound))

static const ld spreads[3] = {1, 1, 200}; /* of a family: an error along the smallest directions is so much larger */

/* C = Y^T Phi + Psi^T X, zero for a tangent (X, Y) at (Phi, Psi) */
static void t_constraint(int n, int N, const ld *x, const ld *u, ld *C)
{
    static ld D[MNN];
    int i;
    mul(n, N, n, 0, u + n * N, 1, x, C);
    mul(n, N, n, 0, x + n * N, 1, u, D);
    for (i = 0; i < n * n; i++) C[i] += D[i];
}

/* A = Phi^T (X - X'): u - Pu = (Psi A, Phi A^T), and the Sylvester residual. */
static void check_normal(int n, int N, const roln_real *p, const ld *X, const ld *U, const ld *P)
{
    static ld A[MNN], B[MNN], C[MNN], D[MNN], t[MS];
    const int nN = n * N, size = 2 * nN;
    const ld nx = sqrtl(dot(size, X, X)), nu = sqrtl(dot(size, U, U));
    ld e;
    int i;
    for (i = 0; i < size; i++) t[i] = U[i] - P[i];
    mul(n, N, n, 0, X, 1, t, A);
    mul(n, n, N, 1, A, 0, X + nN, t);
    for (i = 0; i < nN; i++) t[i] = U[i] - t[i];
    mul(n, n, N, 0, A, 0, X, t + nN);
    for (i = 0; i < nN; i++) t[nN + i] = U[nN + i] - t[nN + i];
    WORST(2, dist(size, p, t) / (nu * nx * nx * EPS), 2);
    t_constraint(n, N, X, U, C);
    mul(n, N, n, 0, X + nN, 1, X + nN, B);
    mul(n, n, n, 0, B, 0, A, D);
    for (i = 0; i < n * n; i++) C[i] -= D[i];
    mul(n, N, n, 0, X, 1, X, B);
    mul(n, n, n, 0, A, 0, B, D);
    for (i = 0; i < n * n; i++) C[i] -= D[i];
    e = nx * nx * sqrtl(dot(n * n, A, A)) + nx * nu;
    WORST(3, sqrtl(dot(n * n, C, C)) / (e * nx * nx * EPS), 2);
}

/* Two vectors at x [2][size] of a family are projected, in p; the length of the first before. */
static ld check_projection(int n, int N, int family, const roln_real *x, roln_real *p, uint64_t *s)
{
    static roln_real u[2 * MS], v[MS], work[ROLN_BIORTH_PROJECT_WORK(MN) + 1];
    static ld X[MS], U[MS], P[MS], V[MS], C[MNN], t[MS];
    const int size = 2 * n * N, need = ROLN_BIORTH_PROJECT_WORK(n);
    ld nx, nu, e;
    int i;
    fill(2 * size, 1, s, u);
    memcpy(p, u, sizeof u);
    work[need] = 77;
    CHECK(roln_biorth_project(n, N, 2, 2 * n * N, x, p, work) == ROLN_OK);
    CHECK(work[need] == 77);
    memcpy(v, u + size, sizeof v); /* two in one call: the same bits */
    CHECK(roln_biorth_project(n, N, 1, 2 * n * N, x, v, work) == ROLN_OK);
    CHECK(memcmp(v, p + size, (size_t)size * sizeof *v) == 0);
    widen(size, x, X), widen(size, u, U), widen(size, p, P), widen(size, v, V);
    nx = sqrtl(dot(size, X, X)), nu = sqrtl(dot(size, U, U));
    t_constraint(n, N, X, P, C); /* tangent */
    e = sqrtl(dot(n * n, C, C)) / (nx * nu * EPS);
    WORST(0, e, 8);
    for (i = 0; i < size; i++) t[i] = U[i] - P[i];
    e = fabsl(dot(size, t, V)) / (nu * sqrtl(dot(size, V, V)) * EPS);
    WORST(1, e, 3 * spreads[family]);
    check_normal(n, N, p, X, U, P);
    if (n <= 5) {
        memcpy(t, U, sizeof t);
        t_project(n, N, X, t);
        WORST(4, dist(size, p, t) / (nu * EPS), 8 * spreads[family]);
    }
    memcpy(v, p, sizeof v); /* idempotent */
    CHECK(roln_biorth_project(n, N, 1, 2 * n * N, x, v, work) == ROLN_OK);
    WORST(5, dist(size, v, P) / (nu * EPS), (family == 2 ? 2000 : 30));
    return nu;
}

/* Retraction along the tangent p / nu: the twin, the constraint, in place, first order. */
static void check_retraction(int n, int N, int family, const roln_real *x, const roln_real *p, ld nu)
{
    static roln_real u[MS], v[MS], y[MS], work[ROLN_BIORTH_RETRACT_WORK(MN, 16) + 1];
    static ld X[MS], V[MS], t[MS];
    const int size = 2 * n * N;
    ld nx;
    int i, q;
    widen(size, x, X), nx = sqrtl(dot(size, X, X));
    memcpy(y, x, sizeof y);
    for (i = 0; i < size; i++) v[i] = p[i] * (roln_real)(0.1L / nu), V[i] = (ld)v[i];
    work[ROLN_BIORTH_RETRACT_WORK(n, N)] = 77;
    CHECK(roln_biorth_retract(n, N, x, v, u, work) == ROLN_OK);
    CHECK(work[ROLN_BIORTH_RETRACT_WORK(n, N)] == 77 && memcmp(x, y, sizeof y) == 0);
    CHECK(roln_biorth_retract(n, N, x, v, v, work) == ROLN_OK);
    CHECK(memcmp(u, v, (size_t)size * sizeof *v) == 0);
    t_retract(n, N, X, V, t);
    WORST(6, dist(size, u, t) / (nx * nx * nx * EPS), 4);
    WORST(7, defect(n, N, u) / EPS, 4);
    if (family < 2 && N > n) {
        ld d[2] = {0, 0};
        for (q = 0; q < 2; q++) {
            const roln_real h = (roln_real)(PICK(0.2L, 1e-3L) / (nu * (q ? 2 : 1)));
            for (i = 0; i < size; i++) v[i] = h * p[i], t[i] = X[i] + (ld)v[i];
            CHECK(roln_biorth_retract(n, N, x, v, v, work) == ROLN_OK);
            d[q] = dist(size, v, t);
        }
        if (d[0] > PICK(2e-3L, 1e-8L)) CHECK_NEAR(d[0] / d[1], 4, PICK(0.6, 0.01));
    }
}

/* What must fail, and leave the output alone. */
static void check_project_failures(uint64_t *s)
{
    static roln_real x[MS], u[MS], p[MS], v[MS], y[MS];
    static roln_real work[ROLN_BIORTH_BLOCK_WORK(3, 7)];
    int i;
    point(3, 7, 0, s, x);
    fill(42, 1, s, u);
    memcpy(p, u, sizeof p), memcpy(y, x, sizeof y);
    memcpy(x + 7, x, 7 * sizeof *x), memcpy(x + 28, x + 21, 7 * sizeof *x); /* both have lost rank */
    CHECK(roln_biorth_project(3, 7, 1, 42, x, u, work) == ROLN_E_ILL_CONDITIONED);
    for (i = 0; i < 42; i++) {
        memcpy(x, y, sizeof x);
        x[i] = (roln_real)(i % 2 ? NAN : INFINITY);
        CHECK(roln_biorth_project(3, 7, 1, 42, x, u, work) == ROLN_E_NOT_FINITE);
        CHECK(roln_biorth_retract(3, 7, x, u, v, work) == ROLN_E_ILL_CONDITIONED);
    }
    CHECK(memcmp(u, p, sizeof p) == 0);
    for (i = 0; i < 42; i++) u[i] = i < 21 ? 0 : i < 28 ? -y[i] : 0; /* Psi + Y loses rank */
    memcpy(x, y, sizeof x);
    CHECK(roln_biorth_retract(3, 7, x, u, v, work) == ROLN_E_ILL_CONDITIONED);
    CHECK(memcmp(x, y, sizeof x) == 0);
    u[21] += y[21] * PICK(1e-7f, 1e-16); /* almost */
    CHECK(roln_biorth_retract(3, 7, x, u, v, work) == ROLN_E_ILL_CONDITIONED);
}

static void test_project(void)
{
    static const int shape[][2] = {{1, 1}, {1, 2}, {2, 3}, {3, 3}, {3, 7}, {4, 8}, {5, 16}, {8, 12}, {12, 16}};
    static roln_real x[MS], p[2 * MS];
    uint64_t s = 1;
    int k, family, rep;
    for (k = 0; k < 9; k++)
        for (family = 0; family < 3; family++)
            for (rep = 0; rep < 10; rep++) {
                const int n = shape[k][0], N = shape[k][1];
                ld nu;
                point(n, N, family, &s, x);
                nu = check_projection(n, N, family, x, p, &s);
                check_retraction(n, N, family, x, p, nu);
            }
    check_project_failures(&s);
}

/* ---- SPD twins ---- */

/* tr(X^-1 U X^-1 U) */
static ld t_metric(int n, const ld *X, const ld *U)
{
    ld a[MNN], b[MNN], c[MNN];
    int i;
    memcpy(a, X, (size_t)(n * n) * sizeof *a), memcpy(b, U, (size_t)(n * n) * sizeof *b);
    t_solve(n, n, a, b);
    mul(n, n, n, 0, b, 0, b, c);
    for (a[0] = 0, i = 0; i < n; i++) a[0] += c[i * n + i];
    return a[0];
}

/* Riemannian gradient and retraction at one X, in the frame of its Cholesky factor. */
static void check_spd(int n, uint64_t *s)
{
    static roln_real X[MNN], G[MNN], u[MNN], Y[MNN], work[ROLN_SPD_RETRACT_WORK(MN) + 1];
    static ld x[MNN], g[MNN], U[MNN], A[MNN], t[MNN], w[MNN];
    ld size, tr = 0, e;
    int i, j;
    random_spd(n, s, X);
    fill(n * n, 1, s, G);
    work[ROLN_SPD_RGRAD_WORK(n)] = 77;
    CHECK(roln_spd_rgrad(n, X, G, u, work) == ROLN_OK);
    CHECK(work[ROLN_SPD_RGRAD_WORK(n)] == 77);
    widen(n * n, X, x), widen(n * n, G, g);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) t[i * n + j] = (g[i * n + j] + g[j * n + i]) / 2;
    t_congruence(n, x, t, U); /* X sym(G) X, and the metric */
    t_chol(n, x, A);
    widen(n * n, u, t);
    t_congruence(n, A, t, w);
    for (e = 0, i = 0; i < n * n; i++) e += (w[i] - U[i]) * (w[i] - U[i]);
    for (i = 0; i < n; i++) tr += x[i * n + i];
    WORST(8, sqrtl(e) / (tr * tr * sqrtl(dot(n * n, g, g)) * EPS), 2);
    size = t_metric(n, x, U);
    CHECK_NEAR((ld)roln_dot(n * n, u, u) / size, 1, 40 * EPS * (ld)n);
    for (i = 0; i < n * n; i++) u[i] = (roln_real)(t[i] *= 0.3L / tr), u[i] = (u[i] + (roln_real)t[i % n * n + i / n]) / 2;
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++) u[j * n + i] = u[i * n + j];
    widen(n * n, u, t);
    t_congruence(n, A, t, U);
    work[ROLN_SPD_RETRACT_WORK(n)] = 77;
    CHECK(roln_spd_retract(n, X, u, Y, work) == ROLN_OK);
    CHECK(work[ROLN_SPD_RETRACT_WORK(n)] == 77);
    t_spd_retract(n, x, U, w);
    WORST(9, dist(n * n, Y, w) / (tr * EPS), 4);
    for (i = 0; i < n * n; i++) CHECK(Y[i] == Y[i % n * n + i / n]);
    memcpy(G, X, sizeof G);
    CHECK(roln_spd_retract(n, G, u, G, work) == ROLN_OK);
    CHECK(memcmp(G, Y, (size_t)(n * n) * sizeof *G) == 0);
    for (j = 0; j < 40; j++) { /* whatever the step: SPD or refused */
        for (i = 0; i < n * n; i++) u[i] = (roln_real)(-powl(4, j - 3) * (t[i] / 3 + (i % (n + 1) == 0)));
        memset(Y, 0, sizeof Y);
        if (roln_spd_retract(n, X, u, Y, work) == ROLN_OK) CHECK(roln_chol(n, Y, G) == ROLN_OK);
        else CHECK(Y[0] == 0 && Y[n * n - 1] == 0 && j > 3);
    }
}

/* What must fail, and leave the output alone. */
static void check_spd_failures(uint64_t *s)
{
    static roln_real X[MNN], u[MNN], Y[MNN], work[ROLN_SPD_BLOCK_WORK(3)];
    int i;
    for (i = 0; i < 9; i++) {
        random_spd(3, s, X);
        memcpy(Y, X, sizeof Y), memcpy(u, X, sizeof u);
        if (i / 3 >= i % 3) { /* the lower triangle is read */
            X[i] = (roln_real)(i % 2 ? NAN : INFINITY);
            CHECK(roln_spd_rgrad(3, X, Y, u, work) == ROLN_E_NOT_SPD);
            CHECK(roln_spd_retract(3, X, Y, u, work) == ROLN_E_NOT_SPD);
            CHECK(memcmp(u, Y, sizeof u) == 0);
        }
        memcpy(X, Y, sizeof X);
        u[i] = (roln_real)(i % 2 ? NAN : INFINITY);
        CHECK(roln_spd_retract(3, X, u, X, work) == ROLN_E_NOT_SPD);
        CHECK(memcmp(X, Y, sizeof X) == 0);
    }
    X[0] = -X[0];
    CHECK(roln_spd_retract(3, X, Y, u, work) == ROLN_E_NOT_SPD);
    CHECK(roln_spd_rgrad(3, X, Y, u, work) == ROLN_E_NOT_SPD);
}

static void test_spd(void)
{
    uint64_t s = 2;
    int n, rep;
    for (n = 1; n <= 10; n++)
        for (rep = 0; rep < 20; rep++) check_spd(n, &s);
    check_spd_failures(&s);
}

/* ---- Stiefel twins ---- */

/* Two vectors Z at X are projected, in P; the length of both before. */
static ld check_stiefel_project(int k, int m, const roln_real *X, roln_real *P, uint64_t *s)
{
    static roln_real Z[2 * MS], V[MS], work[ROLN_STIEFEL_PROJECT_WORK(MN) + 1];
    static ld x[MS], z[2 * MS], p[2 * MS], t[MS], C[MNN];
    const int size = k * m;
    ld nz, d;
    int i;
    fill(2 * size, 1, s, Z);
    memcpy(P, Z, sizeof Z);
    work[ROLN_STIEFEL_PROJECT_WORK(k)] = 77;
    roln_stiefel_project(k, m, 2, k * m, X, P, work);
    CHECK(work[ROLN_STIEFEL_PROJECT_WORK(k)] == 77);
    memcpy(V, Z + size, (size_t)size * sizeof *V); /* two in one call: the same bits */
    roln_stiefel_project(k, m, 1, k * m, X, V, work);
    CHECK(memcmp(V, P + size, (size_t)size * sizeof *V) == 0);
    widen(size, X, x), widen(2 * size, Z, z), widen(2 * size, P, p);
    nz = sqrtl(dot(2 * size, z, z));
    mul(k, m, k, 0, p, 1, x, C); /* tangent */
    for (d = 0, i = 0; i < k * k; i++) d += (C[i] + C[i % k * k + i / k]) * (C[i] + C[i % k * k + i / k]);
    WORST(13, sqrtl(d) / (nz * EPS), 4);
    WORST(14, fabsl(dot(size, p, z + size) - dot(size, z, p + size)) / (nz * nz * EPS), 2); /* self-adjoint */
    memcpy(V, P, (size_t)size * sizeof *V); /* idempotent */
    roln_stiefel_project(k, m, 1, k * m, X, V, work);
    WORST(15, dist(size, V, p) / (nz * EPS), 4);
    memcpy(t, z, (size_t)size * sizeof *t);
    t_stiefel_project(k, m, x, t);
    WORST(16, dist(size, P, t) / (nz * EPS), 2);
    for (i = 0; i < m && k == 1; i++) CHECK_NEAR(P[i], z[i] - dot(m, x, z) * x[i], 4 * nz * EPS); /* the sphere */
    return nz;
}

/* Retraction along P / nz: the twin, the constraint, in place, short and long steps, first order. */
static void check_stiefel_retract(int k, int m, const roln_real *X, const roln_real *P, ld nz)
{
    static roln_real U[MS], Y[MS], V[MS], work[ROLN_STIEFEL_RETRACT_WORK(MN, 20) + 1];
    static ld x[MS], t[MS];
    const int size = k * m, pairs = k > 1 || m > 1; /* 1 x 1: no tangents */
    ld d[2];
    int i, j, q;
    widen(size, X, x);
    for (q = -3; q < 4; q++) {
        const roln_real f = (roln_real)(powl(4, q) / nz);
        for (i = 0; i < size; i++) U[i] = f * P[i], t[i] = x[i] + (ld)U[i];
        work[ROLN_STIEFEL_RETRACT_WORK(k, m)] = 77;
        CHECK(roln_stiefel_retract(k, m, X, U, Y, work) == ROLN_OK);
        CHECK(work[ROLN_STIEFEL_RETRACT_WORK(k, m)] == 77);
        t_orthonormal(k, m, t);
        WORST(17, dist(size, Y, t) / (powl(4, q > 0 ? 2 * q : 0) * EPS), 10);
        WORST(12, skewness(k, m, Y) / EPS, 6);
        memcpy(V, X, sizeof V);
        CHECK(roln_stiefel_retract(k, m, V, U, V, work) == ROLN_OK && memcmp(V, Y, (size_t)size * sizeof *V) == 0);
        CHECK(roln_stiefel_retract(k, m, X, U, U, work) == ROLN_OK && memcmp(U, Y, (size_t)size * sizeof *U) == 0);
    }
    for (q = 0; q < 2; q++) { /* first order: half the step, a quarter of the distance to X + U */
        const roln_real h = (roln_real)(PICK(0.1L, 1e-3L) / (nz * (q ? 2 : 1)));
        for (i = 0; i < size; i++) U[i] = h * P[i], t[i] = x[i] + (ld)U[i];
        CHECK(roln_stiefel_retract(k, m, X, U, U, work) == ROLN_OK);
        d[q] = dist(size, U, t);
    }
    if (pairs && d[0] > PICK(1e-3L, 1e-8L)) CHECK_NEAR(d[0] / d[1], 4, PICK(0.2, 0.01));

    for (j = 0; j < 80; j++) { /* whatever the step: on the manifold or refused */
        for (i = 0; i < size; i++) U[i] = (roln_real)powl(10, j - 2) * P[i], V[i] = 7;
        if (roln_stiefel_retract(k, m, X, U, V, work) == ROLN_OK) CHECK_BELOW(skewness(k, m, V) / EPS, 6);
        else {
            for (i = 0; i < size && V[i] == 7; i++) {}
            CHECK(j > 3 && i == size);
        }
    }
}

/* What must fail, and leave the output alone: k = 1; k < m; k = m. */
static void check_stiefel_failures(int k, int m, uint64_t *s)
{
    static roln_real X[MS], Z[MS], U[MS], Y[MS], work[ROLN_STIEFEL_BLOCK_WORK(3, 5)];
    const int size = k * m;
    int i, q;
    CHECK(roln_stiefel_init(k, m, X, s, work) == ROLN_OK);
    memset(Z, 0, sizeof Z);
    for (i = 0; i < size; i++)
        for (q = 0; q < 4; q++) {
            const roln_real bad = (roln_real)(q % 2 ? NAN : INFINITY), was = X[i];
            memcpy(Y, Z, sizeof Y), memcpy(U, Z, sizeof U);
            if (q < 2) X[i] = bad;
            else U[i] = bad;
            CHECK(roln_stiefel_retract(k, m, X, U, Y, work) == ROLN_E_ILL_CONDITIONED);
            CHECK(memcmp(Y, Z, sizeof Y) == 0);
            X[i] = was;
        }
    memcpy(Y, X, sizeof Y), memset(U, 0, sizeof U);
    for (i = 0; i < m; i++) U[i] = (k > 1 ? X[m + i] : 0) - X[i]; /* X + U: row 0 vanishes, or is row 1 */
    CHECK(roln_stiefel_retract(k, m, Y, U, Y, work) == ROLN_E_ILL_CONDITIONED);
    CHECK(memcmp(Y, X, sizeof Y) == 0);
    for (i = 0; i < m; i++) U[i] += X[i] * PICK(1e-3f, 1e-7); /* almost */
    if (k > 1) CHECK(roln_stiefel_retract(k, m, Y, U, Y, work) == ROLN_E_ILL_CONDITIONED);
    for (i = 0; i < m; i++) U[i] += X[i] * PICK(1e-1f, 1e-3);
    CHECK(roln_stiefel_retract(k, m, Y, U, Y, work) == ROLN_OK);
    CHECK_BELOW(skewness(k, m, Y) / EPS, 6);
}

/* 10,000 random steps, of lengths 0.01 to 10 */
static void check_stiefel_walk(int k, int m, uint64_t *s)
{
    static roln_real X[MS], U[MS], work[ROLN_STIEFEL_BLOCK_WORK(4, 7)];
    ld top = 0;
    int q, ok = roln_stiefel_init(k, m, X, s, work) == ROLN_OK;
    for (q = 0; q < 10000; q++) {
        fill(k * m, powl(10, q % 4 - 2) / sqrtl(k * m), s, U);
        roln_stiefel_project(k, m, 1, k * m, X, U, work);
        ok &= roln_stiefel_retract(k, m, X, U, X, work) == ROLN_OK;
        if (!(skewness(k, m, X) <= top)) top = skewness(k, m, X);
    }
    CHECK(ok);
    WORST(18, top / EPS, 6);
}

/* Initial points are uniform: the moments of every number, and of the determinant. */
static void check_stiefel_uniform(uint64_t *s)
{
    roln_real X[4], work[ROLN_STIEFEL_INIT_WORK(2)];
    ld mean[4] = {0, 0, 0, 0}, square[4] = {0, 0, 0, 0}, det = 0;
    int i, j;
    for (j = 0; j < 4000; j++) {
        CHECK(roln_stiefel_init(2, 2, X, s, work) == ROLN_OK);
        for (i = 0; i < 4; i++) mean[i] += (ld)X[i] / 4000, square[i] += (ld)X[i] * (ld)X[i] / 4000;
        det += (ld)(X[0] * X[3] - X[1] * X[2]) / 4000;
    }
    for (i = 0; i < 4; i++) CHECK_NEAR(mean[i], 0, 0.045), CHECK_NEAR(square[i], 0.5, 0.025); /* 4 sigma */
    CHECK_NEAR(det, 0, 0.065);
}

static void test_stiefel(void)
{
    static const int shape[][2] = {{1, 1}, {1, 2}, {1, 9}, {2, 2}, {2, 3}, {4, 8}, {5, 16}, {10, 20}, {12, 12}, {12, 16}};
    static roln_real X[MS], P[2 * MS], work[ROLN_STIEFEL_INIT_WORK(MN) + 1];
    uint64_t s = 8;
    int c, rep;
    for (c = 0; c < 10; c++)
        for (rep = 0; rep < 20; rep++) {
            const int k = shape[c][0], m = shape[c][1];
            ld nz;
            work[ROLN_STIEFEL_INIT_WORK(k)] = 77;
            CHECK(roln_stiefel_init(k, m, X, &s, work) == ROLN_OK);
            CHECK(work[ROLN_STIEFEL_INIT_WORK(k)] == 77);
            WORST(12, skewness(k, m, X) / EPS, 6);
            nz = check_stiefel_project(k, m, X, P, &s);
            check_stiefel_retract(k, m, X, P, nz);
        }
    check_stiefel_failures(1, 5, &s);
    check_stiefel_failures(2, 5, &s);
    check_stiefel_failures(3, 3, &s);
    check_stiefel_walk(1, 7, &s);
    check_stiefel_walk(4, 7, &s);
    check_stiefel_walk(4, 4, &s);
    check_stiefel_uniform(&s);
}

/* ---- optimisers, on the table of every manifold ---- */

/* learning-rate group of the number i */
static int group(int i)
{
    return (i >= AT_B && i < AT_S) || (i >= AT_E && i < AT_B2) || (i >= AT_T && i < AT_U);
}

typedef struct { roln_real x[SIZE], m[SIZE], v[MOMENTS], w[MOMENTS]; roln_adam a; } run;

static roln_real owork[400];

static void start(run *r, uint64_t *s)
{
    memset(r, 0, sizeof *r);
    point_of_table(s, r->x);
}

static roln_status adam(const roln_opt *o, roln_real scale, const roln_real *g, run *r)
{
    const int need = roln_update_work(BLOCKS, table);
    roln_status st;
    owork[need] = owork[need + 1] = 77;
    st = roln_adam_update(BLOCKS, table, o, scale, g, r->x, &r->a, &(roln_moments){r->m, r->v, r->w}, owork);
    CHECK(owork[need] == 77 && owork[need + 1] == 77);
    return st;
}

/* Adam on the product manifold of one table, from its formulas, in long double. SPD tangents are full matrices,
   carried from X = A A^T to X' by E = A' A^-1. */
typedef struct { ld x[SIZE], m[SIZE], v[MOMENTS], w[MOMENTS], p1, p2; } twin;

static void t_update(const roln_opt *o, ld scale, const roln_real *grad, twin *t)
{
    ld norm = 0, clip = 1, g[MS], u[MS], y[MS], A[MNN], B[MNN];
    int b, i, at = 0, av = 0;
    for (b = 0; b < BLOCKS; at += roln_block_size(table + b), b++)
        for (i = 0; i < roln_block_size(table + b) && (ld)o->lr[table[b].group] > 0; i++)
            norm += (ld)grad[at + i] * (ld)grad[at + i];
    norm = scale * sqrtl(norm);
    if ((ld)o->clip > 0 && norm > (ld)o->clip) clip = (ld)o->clip / norm;
    t->p1 *= (ld)o->beta1, t->p2 *= (ld)o->beta2;
    for (b = at = 0; b < BLOCKS; b++) {
        const roln_block *k = table + b;
        const int size = roln_block_size(k), each = k->manifold == ROLN_EUCLIDEAN, n = k->rows, N = k->cols;
        ld *x = t->x + at, *m = t->m + at, gg, f, lr = (ld)o->lr[k->group];
        if (lr > 0 && size > 0) {
            for (i = 0; i < size; i++) g[i] = clip * scale * (ld)grad[at + i] + (ld)o->decay * x[i];
            if (k->manifold == &roln_biorthogonal) t_project(n, N, x, g), t_project(n, N, x, m);
            if (k->manifold == &roln_stiefel || k->manifold == &sphere)
                t_stiefel_project(n, N, x, g), t_stiefel_project(n, N, x, m);
            if (k->manifold == &roln_spd) {
                for (i = 0; i < size; i++) u[i] = (g[i] + g[i % n * n + i / n]) / 2;
                t_congruence(n, x, u, g);
            }
            gg = k->manifold == &roln_spd ? t_metric(n, x, g) : dot(size, g, g);
            for (i = 0; i < size; i++) {
                if (i == 0 || each) {
                    t->v[av + i] = (ld)o->beta2 * t->v[av + i] + (1 - (ld)o->beta2) * (each ? g[i] * g[i] : gg);
                    if (t->v[av + i] > t->w[av + i]) t->w[av + i] = t->v[av + i];
                }
                m[i] = (ld)o->beta1 * m[i] + (1 - (ld)o->beta1) * g[i];
                f = sqrtl(t->w[av + (each ? i : 0)] / (1 - t->p2)) + (ld)o->eps;
                u[i] = -lr * (m[i] / (1 - t->p1)) / f;
            }
            if (each) for (i = 0; i < size; i++) x[i] += u[i];
            else if (k->manifold == &roln_biorthogonal) t_retract(n, N, x, u, y), memcpy(x, y, (size_t)size * sizeof *x);
            else if (k->manifold != &roln_spd) {
                for (i = 0; i < size; i++) x[i] += u[i];
                t_orthonormal(n, N, x);
            } else {
                t_spd_retract(n, x, u, y);
                t_chol(n, x, A);
                t_chol(n, y, B);
                for (i = 0; i < size; i++) g[i] = A[i % n * n + i / n], u[i] = B[i % n * n + i / n];
                t_solve(n, n, g, u); /* A^-T B^T = E^T */
                for (i = 0; i < size; i++) g[i] = u[i % n * n + i / n];
                t_congruence(n, g, m, u);
                memcpy(m, u, (size_t)size * sizeof *m), memcpy(x, y, (size_t)size * sizeof *x);
            }
        }
        at += size, av += each ? size : size > 0;
    }
}

static const roln_opt opts[5] = {{{ROLN_C(0.01), ROLN_C(0.02)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0},
                                 {{ROLN_C(0.01), ROLN_C(0.02)}, ROLN_C(0.8), ROLN_C(0.9), ROLN_C(1e-3), ROLN_C(0.1), 2},
                                 {{ROLN_C(0.01), 0}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), ROLN_C(0.01), ROLN_C(0.5)},
                                 {{0, ROLN_C(0.02)}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), ROLN_C(0.01), 4},
                                 {{0, 0}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), ROLN_C(0.01), 4}};

/* The Euclidean numbers of a step from `old` to r, bit for bit. */
static void check_euclidean(const roln_opt *opt, roln_real scale, const roln_real *g, const run *old, const run *r)
{
    int i;
    for (i = 0; i < 10; i++) {
        const int p = i < 6 ? i : AT_E + i - 6, q = i < 6 ? i : i + 2;
        const roln_real b1 = opt->beta1, b2 = opt->beta2, gi = scale * g[p] + opt->decay * old->x[p];
        const roln_real m = b1 * old->m[p] + (1 - b1) * gi, v = b2 * old->v[q] + (1 - b2) * (gi * gi);
        const roln_real w = v > old->w[q] ? v : old->w[q], lr = opt->lr[i >= 6];
        CHECK(r->x[p] == old->x[p] - lr * (m / r->a.unbias1) / (ROLN_SQRT(w / r->a.unbias2) + opt->eps));
        CHECK(r->m[p] == m && r->v[q] == v && r->w[q] == w);
    }
}

/* 60 updates and the twin's. */
static void check_updates(const roln_opt *opt, uint64_t *s)
{
    static run r, was;
    static twin t;
    roln_real g[SIZE];
    int k, i;
    start(&r, s);
    was = r;
    memset(&t, 0, sizeof t);
    widen(SIZE, r.x, t.x);
    t.p1 = t.p2 = 1;
    for (k = 1; k <= 60; k++) {
        const roln_real scale = ROLN_C(0.25);
        const run old = r;
        fill(SIZE, k < 20 ? 2 : 1, s, g); /* falling: vmax differs from v */
        for (i = 0; i < SIZE; i++)
            if (opt->lr[group(i)] <= 0) g[i] = (roln_real)NAN; /* frozen */
        t_update(opt, 0.25L, g, &t);
        CHECK(adam(opt, scale, g, &r) == ROLN_OK);
        CHECK(r.a.t == (uint32_t)k);
        CHECK_NEAR(r.a.unbias1, 1 - t.p1, 8 * EPS);
        CHECK_NEAR(r.a.unbias2, 1 - t.p2, (ld)k * EPS);
        if (opt == opts) check_euclidean(opt, scale, g, &old, &r);
    }
    for (i = 0; i < SIZE; i++) { /* a momentum that is projected is carried only when next used */
        const int curved = (i >= AT_B && i < AT_E) || i >= AT_B2;
        WORST(10, fabsl((ld)r.x[i] - t.x[i]) / EPS, 150);
        if (!curved) CHECK_NEAR(r.m[i], t.m[i], 60 * EPS);
    }
    for (i = 0; i < MOMENTS; i++) {
        CHECK_NEAR(r.v[i], t.v[i], 300 * EPS * (1 + t.v[i]));
        CHECK_NEAR(r.w[i], t.w[i], 300 * EPS * (1 + t.w[i]));
    }
    for (i = 0; i < SIZE; i++) /* frozen: bit for bit */
        if (opt->lr[group(i)] <= 0) CHECK(r.x[i] == was.x[i] && r.m[i] == 0);
    CHECK_BELOW(defect(2, 5, r.x + AT_B), 4 * EPS);
    CHECK_BELOW(skewness(2, 4, r.x + AT_T), 6 * EPS);
}

/* Resume: 200 steps = 100, copy, 100. */
static void check_resume(void)
{
    static run a, b;
    roln_real g[SIZE];
    uint64_t seed = 4, keep;
    int k;
    start(&a, &seed);
    for (k = 0; k < 100; k++) fill(SIZE, 1, &seed, g), CHECK(adam(opts + 1, 1, g, &a) == ROLN_OK);
    b = a, keep = seed;
    for (k = 0; k < 100; k++) fill(SIZE, 1, &seed, g), CHECK(adam(opts + 1, 1, g, &a) == ROLN_OK);
    for (k = 0; k < 100; k++) fill(SIZE, 1, &keep, g), CHECK(adam(opts + 1, 1, g, &b) == ROLN_OK);
    CHECK(memcmp(&a, &b, sizeof a) == 0);
}

/* Clipping: the first momentum of the Euclidean blocks has length (1 - beta1) clip. */
static void check_clipping(uint64_t *s)
{
    const roln_block flat = {ROLN_EUCLIDEAN, 3, 5, 1};
    roln_opt q = opts[0];
    static run r;
    roln_real g[15], x[15];
    ld len = 0;
    int i;
    fill(15, 1, s, g);
    fill(15, 1, s, x);
    q.clip = ROLN_C(0.125), q.decay = 0;
    CHECK(roln_adam_update(1, &flat, &q, 7, g, x, &r.a, &(roln_moments){r.m, r.v, r.w}, NULL) == ROLN_OK);
    for (i = 0; i < 15; i++) len += (ld)r.m[i] * (ld)r.m[i];
    CHECK_NEAR(sqrtl(len), (1 - (ld)q.beta1) * 0.125L, 20 * EPS);
    CHECK(roln_update_work(1, &flat) == 0 && roln_update_work(0, &flat) == 0);
    CHECK(roln_adam_update(0, &flat, &q, 1, g, x, &r.a, &(roln_moments){r.m, r.v, r.w}, NULL) == ROLN_OK);
}

static void test_adam(void)
{
    uint64_t s = 3;
    int o;
    for (o = 0; o < 5; o++) check_updates(opts + o, &s);
    check_resume();
    check_clipping(&s);
}

#define UNTOUCHED(cond) (CHECK(cond), CHECK(memcmp(&r, &was, sizeof r) == 0))

/* X not SPD, rank lost: in the block alone, so that it is its own status that comes back; a scale that is no number. */
static void check_own_status(const roln_opt *opt, const roln_real *g, const run *good)
{
    static run r, was;
    int k;
    r = *good;
    r.x[AT_S] = -1, was = r;
    UNTOUCHED(adam(opt, 1, g, &r) == ROLN_E_NOT_SPD);
    r.x[AT_S] = 4;
    memset(r.x + AT_B2, 0, 12 * sizeof *r.x), was = r;
    UNTOUCHED(adam(opt, 1, g, &r) == ROLN_E_ILL_CONDITIONED);
    memcpy(r.x + AT_B2, good->x + AT_B2, 12 * sizeof *r.x);
    r.x[AT_T] = (roln_real)NAN, was = r;
    UNTOUCHED(adam(opt, 1, g, &r) == ROLN_E_NOT_FINITE);
    for (k = 0; k < 3; k++) { /* scale */
        was = r;
        UNTOUCHED(adam(opt, (roln_real)(k == 0 ? NAN : k == 1 ? INFINITY : -INFINITY), g, &r) == ROLN_E_NOT_FINITE);
    }
}

/* Nothing is written when a step fails: every kind of failure at every number. */
static void test_failures(void)
{
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.02)}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), ROLN_C(0.01), 0};
    static run r, was, good;
    roln_real g[SIZE], keep[SIZE];
    uint64_t s = 5;
    int i, k, kind;
    start(&r, &s);
    for (i = 0; i < 3; i++) fill(SIZE, 1, &s, g), CHECK(adam(&opt, 1, g, &r) == ROLN_OK);
    fill(SIZE, 1, &s, keep);
    for (i = 0; i < SIZE; i++)
        for (k = 0; k < 3; k++) { /* gradient */
            memcpy(g, keep, sizeof g);
            g[i] = (roln_real)(k == 0 ? NAN : k == 1 ? INFINITY : -INFINITY);
            was = r;
            UNTOUCHED(adam(&opt, 1, g, &r) == ROLN_E_NOT_FINITE);
        }
    memcpy(g, keep, sizeof g);
    for (i = 0; i < SIZE; i++) { /* parameters, momentum */
        good = r;
        r.x[i] = (roln_real)NAN;
        was = r;
        if (i < AT_S || i >= AT_E || (i - AT_S) / 3 >= (i - AT_S) % 3) {
            UNTOUCHED(adam(&opt, 1, g, &r) != ROLN_OK);
        }
        r = good;
        r.m[i] = (roln_real)INFINITY;
        was = r;
        UNTOUCHED(adam(&opt, 1, g, &r) != ROLN_OK);
        r = good;
    }
    for (kind = 0; kind < 2; kind++) /* a step too long, in one group: the blocks of the other must not move either */
        for (k = 0; k < 2; k++) {
            roln_opt o = opt;
            o.lr[kind] = k ? (roln_real)NAN : PICK(3e38f, 1e308);
            if (k) o.lr[kind] = 0, o.lr[!kind] = PICK(3e38f, 1e308);
            good = r;
            r.x[kind == k ? 0 : AT_E] = PICK(3e38f, 1e308); /* free numbers of the group; a manifold shortens the step */
            was = r;
            UNTOUCHED(adam(&o, 1, g, &r) != ROLN_OK);
            r = good;
        }
    check_own_status(&opt, g, &r);
}

/* The work of an update, to the number: filled with a sentinel, the end is used, the next is not. */
static void test_work(void)
{
    static const roln_block one[5] = {{&roln_biorthogonal, 2, 16, 0}, {&roln_biorthogonal, 4, 5, 0}, {&roln_spd, 4, 4, 0},
                                      {ROLN_EUCLIDEAN, 1, 3, 0}, {&roln_stiefel, 3, 5, 0}};
    const roln_opt opt = {{ROLN_C(0.01), 0}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), 0, 0};
    uint64_t s = 6;
    int k, i;
    for (k = 0; k < 5; k++) {
        const int need = roln_update_work(1, one + k);
        roln_real x[80] = {0}, m[80] = {0}, v[80] = {0}, w[80] = {0}, g[80];
        roln_adam a = {0, 0, 0};
        fill(80, 1, &s, g);
        if (one[k].manifold == &roln_biorthogonal) point(one[k].rows, one[k].cols, 0, &s, x);
        else if (one[k].manifold == &roln_stiefel) CHECK(roln_stiefel_init(3, 5, x, &s, owork) == ROLN_OK);
        else random_spd(4, &s, x);
        for (i = 0; i < 400; i++) owork[i] = 77;
        CHECK(roln_adam_update(1, one + k, &opt, 1, g, x, &a, &(roln_moments){m, v, w}, owork) == ROLN_OK);
        for (i = need; i < 400; i++) CHECK(owork[i] == 77);
        CHECK(need == 0 || owork[need - (k == 1 ? 2 : 1)] != 77); /* roln_eig leaves its last number */
        CHECK(roln_adam_update(1, one + k, &opt, PICK(1e25f, 1e170), g, x, &a, &(roln_moments){m, v, w},
                               owork) == ROLN_E_NOT_FINITE); /* <g, g> */
        CHECK(a.t == 1 && roln_finite(v[0]) && roln_finite(w[0]));
        w[0] = (roln_real)INFINITY; /* a largest second moment that is none */
        CHECK(roln_adam_update(1, one + k, &opt, 1, g, x, &a, &(roln_moments){m, v, w}, owork) == ROLN_E_NOT_FINITE && a.t == 1);
    }
}

/* Scratch of the functions by themselves, and of an update of every block. */
static void test_rooms(void)
{
    static const roln_block one[] = {{&roln_biorthogonal, 1, 1, 0}, {&roln_biorthogonal, 2, 16, 0}, {&roln_biorthogonal, 4, 5, 0},
                                     {&roln_biorthogonal, 8, 8, 0}, {&roln_spd, 1, 1, 0}, {&roln_spd, 2, 2, 0},
                                     {&roln_spd, 7, 7, 0}, {&roln_stiefel, 1, 1, 0}, {&roln_stiefel, 3, 5, 0},
                                     {&roln_stiefel, 4, 4, 0}, {&sphere, 3, 3, 0}, {ROLN_EUCLIDEAN, 3, 3, 0}};
    const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), 0, 0};
    static roln_real all[SIZE], g[2 * MS], x[MS], u[MS], m[MS], v[MS], w[MS];
    uint64_t s = 10;
    int k;
    for (k = 0; k < (int)(sizeof one / sizeof *one); k++) {
        const roln_block *b = one + k;
        const int rows = b->rows, cols = b->cols, need = roln_update_work(1, b);
        roln_adam a = {0, 0, 0};
        fill(2 * MS, 0.1L, &s, g);
        memset(m, 0, sizeof m), memset(v, 0, sizeof v), memset(w, 0, sizeof w);
        if (b->manifold == &roln_biorthogonal) {
            point(rows, cols, 0, &s, x);
            CHECK(roln_biorth_project(rows, cols, 2, 2 * rows * cols, x, g, room_of(ROLN_BIORTH_PROJECT_WORK(rows))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(roln_biorth_retract(rows, cols, x, g, u, room_of(ROLN_BIORTH_RETRACT_WORK(rows, cols))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(need == 4 * rows * cols + 2 + ROLN_BIORTH_BLOCK_WORK(rows, cols));
        } else if (b->manifold == &roln_spd) {
            random_spd(rows, &s, x);
            CHECK(roln_spd_rgrad(rows, x, g, u, room_of(ROLN_SPD_RGRAD_WORK(rows))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(roln_spd_retract(rows, x, u, u, room_of(ROLN_SPD_RETRACT_WORK(rows))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(need == 2 * rows * rows + 2 + ROLN_SPD_BLOCK_WORK(rows));
        } else if (b->manifold == &roln_stiefel) {
            CHECK(roln_stiefel_init(rows, cols, x, &s, room_of(ROLN_STIEFEL_INIT_WORK(rows))) == ROLN_OK);
            CHECK_ROOM();
            roln_stiefel_project(rows, cols, 2, rows * cols, x, g, room_of(ROLN_STIEFEL_PROJECT_WORK(rows)));
            CHECK_ROOM();
            CHECK(roln_stiefel_retract(rows, cols, x, g, u, room_of(ROLN_STIEFEL_RETRACT_WORK(rows, cols))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(need == 2 * rows * cols + 2 + ROLN_STIEFEL_BLOCK_WORK(rows, cols));
        } else {
            fill(rows * cols, 1, &s, x);
        }
        CHECK(roln_adam_update(1, b, &opt, 1, g, x, &a, &(roln_moments){m, v, w}, room_of(need)) == ROLN_OK);
        CHECK_ROOM();
    }
    {
        static run r;
        start(&r, &s);
        fill(SIZE, 1, &s, all);
        CHECK(roln_adam_update(BLOCKS, table, &opt, 1, all, r.x, &r.a, &(roln_moments){r.m, r.v, r.w},
                               room_of(roln_update_work(BLOCKS, table))) == ROLN_OK);
        CHECK_ROOM();
    }
}

/* tr(X) tr(X^-1) in long double. */
static ld traces(int n, const roln_real *X)
{
    ld x[MNN], y[MNN], trace = 0, inverse = 0;
    int i;
    widen(n * n, X, x);
    for (i = 0; i < n * n; i++) y[i] = i % (n + 1) == 0;
    for (i = 0; i < n; i++) trace += x[i * (n + 1)];
    t_solve(n, n, x, y);
    for (i = 0; i < n; i++) inverse += y[i * (n + 1)];
    return trace * inverse;
}

/* g = Euclidean gradient; framed: that whose Riemannian gradient in the frame of X is G, A^-T G A^-1. */
static void edge_gradient(int n, int framed, roln_real sign, const roln_real *X, const roln_real *G, roln_real *g)
{
    ld x[MNN], A[MNN], t[MNN];
    int i;
    if (framed) {
        widen(n * n, X, x);
        t_chol(n, x, A);
        for (i = 0; i < n * n; i++) x[i] = A[i % n * n + i / n], t[i] = (ld)G[i];
        memcpy(A, x, (size_t)(n * n) * sizeof *A);
        t_solve(n, n, A, t); /* A^-T G, then the same from the right, by symmetry */
        for (i = 0; i < n * n; i++) A[i] = t[i % n * n + i / n];
        t_solve(n, n, x, A);
        for (i = 0; i < n * n; i++) g[i] = sign * (roln_real)A[i];
    } else {
        for (i = 0; i < n * n; i++) g[i] = sign * G[i];
    }
}

/* A gradient that never changes drives an SPD block to the edge of what can be factored; it waits there, every update is ROLN_OK,
   and when the gradient turns it comes back. Up to version 0.3.0 it was refused for ever. */
static void check_edge(int n, int framed, uint64_t *s)
{
    const roln_block b = {&roln_spd, n, n, 0};
    const ld limit = 1 / (64 * EPS);
    const roln_opt o = {{ROLN_C(0.05), 0, 0}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    roln_real X[MNN], at[MNN], G[MNN], g[MNN], m[MNN] = {0}, v = 0, w = 0, l[MN], Q[MNN], work[ROLN_EIG_WORK(MN)];
    roln_adam a = {0, 0, 0};
    const int outward = framed ? 4000 : 1000;
    ld top = 0, end;
    roln_real turn = 0;
    int i, k, ok = 1, moved = 0, near = 0;
    for (i = 0; i < n * n; i++) X[i] = i % (n + 1) == 0, G[i] = X[i] * (roln_real)(i / n % 2 ? 1 : -1);
    for (i = 0; i < n * n && !framed; i++)
        if (i / n > i % n) G[i] = G[i % n * n + i / n] = ROLN_C(0.2) * roln_normal(s);
    for (k = 0; k < 3 * outward; k++) {
        edge_gradient(n, framed, k < outward ? 1 : -1, X, G, g);
        ok &= roln_adam_update(1, &b, &o, 1, g, X, &a, &(roln_moments){m, &v, &w}, owork) == ROLN_OK;
        if (k % 10 == 0 && (end = traces(n, X)) > top) top = end;
        if (k == outward - 1) {
            memcpy(at, X, sizeof at);
            CHECK(roln_eig(n, X, l, Q, work) == ROLN_OK);
            turn = l[n - 1];
        }
        if (k == outward + 100) moved = memcmp(at, X, (size_t)(n * n) * sizeof *X) != 0;
        if (k > outward && k % 10 == 0) {
            ld d = 0;
            CHECK(roln_eig(n, X, l, Q, work) == ROLN_OK);
            for (i = 0; i < n; i++) d = fmaxl(d, fabsl(logl((ld)l[i])));
            near |= d < 0.5L; /* a geodesic through I */
            if (k == 3 * outward - 10 && !framed) CHECK_BELOW(l[n - 1], turn / 20); /* slower: v_max does not forget */
        }
    }
    CHECK(ok);
    CHECK(moved);
    CHECK_BELOW(top, 1.01L * limit);
    if (n > 1) CHECK_BELOW(limit / 20, top); /* it has been there */
    if (framed) CHECK(near);
}

static void test_edge(void)
{
    uint64_t s = 13;
    int n;
    for (n = 1; n <= 8; n += n < 4 ? 1 : 2) {
        check_edge(n, 0, &s);
        check_edge(n, 1, &s);
    }
}

/* ---- there and back ---- */

static const roln_block roads[] = {
    {ROLN_EUCLIDEAN, 1, 1, 0}, {ROLN_EUCLIDEAN, 8, 8, 0}, {&roln_spd, 1, 1, 0}, {&roln_spd, 2, 2, 0}, {&roln_spd, 8, 8, 0},
    {&roln_biorthogonal, 1, 1, 0}, {&roln_biorthogonal, 1, 30, 0}, {&roln_biorthogonal, 2, 30, 0},
    {&roln_biorthogonal, 4, 16, 0}, {&roln_biorthogonal, 8, 8, 0}, {&roln_stiefel, 1, 1, 0}, {&roln_stiefel, 2, 30, 0},
    {&roln_stiefel, 4, 16, 0}, {&roln_stiefel, 8, 8, 0}, {&sphere, 1, 1, 0}, {&sphere, 1, 30, 0}, {&mode, 1, MASSES, 0}};

typedef struct {
    const roln_block *b;
    int size;
    roln_opt o;
    roln_real x[MS], m[MS], v[MS], w[MS], work[4 * MS];
    roln_adam a;
} road;

/* Every manifold at a point like that where a training begins. */
static void road_start(const roln_block *b, roln_real lr, uint64_t *s, road *r)
{
    int i;
    memset(r, 0, sizeof *r);
    r->b = b, r->size = roln_block_size(b);
    r->o.lr[0] = lr, r->o.beta1 = ROLN_C(0.9), r->o.beta2 = ROLN_C(0.999), r->o.eps = ROLN_C(1e-8);
    CHECK(r->size <= MS && roln_update_work(1, b) <= 4 * MS);
    if (b->manifold == &roln_spd) random_spd(b->rows, s, r->x);
    else if (b->manifold == &mode) r->x[0] = 1;
    else if (b->manifold) CHECK(roln_stiefel_init(b->rows, b->cols, r->x, s, r->work) == ROLN_OK);
    if (b->manifold == &roln_biorthogonal) memcpy(r->x + r->size / 2, r->x, (size_t)(r->size / 2) * sizeof *r->x);
    for (i = 0; i < r->size && b->manifold == ROLN_EUCLIDEAN; i++) r->x[i] = roln_normal(s);
}

/* An update; nonzero if it is taken, and ends on the manifold. */
static int road_step(const roln_real *g, road *r)
{
    const roln_block *b = r->b;
    if (roln_adam_update(1, b, &r->o, 1, g, r->x, &r->a, &(roln_moments){r->m, r->v, r->w}, r->work) != ROLN_OK) return 0;
    if (b->manifold == &roln_biorthogonal) return apart(b->rows, b->cols, r->x) <= 84 * EPS;
    if (b->manifold == &roln_stiefel) return skewness(b->rows, b->cols, r->x) <= 6 * EPS;
    if (b->manifold == &sphere) return skewness(1, b->cols, r->x) <= 6 * EPS;
    if (b->manifold == &mode) return fabsl((ld)mode_inner(1, MASSES, r->x, r->x, r->x) - 1) <= 8 * EPS;
    return 1; /* of SPD the next update asks */
}

enum { CONSTANT, ALTERNATING, RANDOM, WILD, KINDS };

/* Gradients of the kind, times size; of every size from 1e-10 to 1e10 in turn, WILD, along one direction G. */
static void road_gradient(int kind, int k, int n, ld size, const roln_real *G, uint64_t *s, roln_real *g)
{
    const ld f = size * (kind == ALTERNATING && k % 2 ? -1 : 1) * (kind == WILD ? powl(10, 20 * (ld)roln_uniform(s) - 10) : 1);
    int i;
    if (kind == RANDOM) fill(n, f, s, g);
    else
        for (i = 0; i < n; i++) g[i] = (roln_real)f * G[i];
}

/* Updates are taken wherever those before have led. With nearly opposite gradients the point leaves the place where it turns, if it
   has ever moved. Up to version 0.3.0 a pair was refused for ever behind 1,058 updates. */
static void check_back(const roln_block *b, int kind, ld size, int updates, uint64_t *s)
{
    static road r;
    roln_real G[MS], g[MS], from[MS], turn[MS];
    int k, i, ok = 1, moved = 0, back;
    road_start(b, ROLN_C(0.05), s, &r);
    memcpy(from, r.x, sizeof from);
    fill(r.size, 1, s, G);
    for (k = 0; k < updates; k++) road_gradient(kind, k, r.size, size, G, s, g), ok &= road_step(g, &r);
    for (i = 0; i < r.size; i++) moved |= ROLN_ABS(r.x[i] - from[i]) > 64 * ROLN_EPS; /* by more than rounding */
    memcpy(turn, r.x, sizeof turn);
    for (i = 0; i < r.size; i++) /* at a minimum of <G, x> the opposite of G is 0, too */
        G[i] *= 1 + ROLN_C(0.1) * (roln_real)(i % 3);
    for (k = 0; k < updates / 10; k++) road_gradient(kind, k, r.size, -size, G, s, g), ok &= road_step(g, &r);
    back = memcmp(turn, r.x, sizeof turn) != 0;
    for (i = 0; i < r.size; i++) ok &= roln_finite(r.x[i]) && roln_finite(r.m[i]);
    back |= !moved || kind == ALTERNATING; /* which may end where it begins */
    if (!ok || !back) printf("block %d, gradients %d of %Lg\n", (int)(b - roads), kind, size);
    CHECK(ok && back);
}

static void test_back(void)
{
    static const ld size[] = {1e-10L, 1, 1e10L};
    uint64_t s = 17;
    int c, kind, q;
    for (c = 0; c < (int)(sizeof roads / sizeof *roads); c++) {
        const int updates = check_sample ? 2000 : roads[c].manifold == &roln_biorthogonal ? 100000 : 20000;
        for (kind = 0; kind < KINDS; kind++)
            for (q = kind == WILD; q < (kind == WILD ? 2 : 3); q++)
                check_back(roads + c, kind, size[q], q == 1 ? updates : updates / 10, &s);
    }
}

/* From far outside a pair comes in, along the gradient of |Phi|^2 + |Psi|^2, and is inside no more than its bound apart. */
static void test_outside(void)
{
    static road r;
    uint64_t s = 18;
    int n, k, ok;
    for (n = 2; n < 9; n += 3) {
        const roln_block b = {&roln_biorthogonal, n, 9, 0};
        road_start(&b, PICK(0.5f, 50), &s, &r);
        point(n, 9, 2, &s, r.x);
        CHECK(norms(n, 9, r.x) > 36 + 2 * n);
        for (ok = 1, k = 0; k < 3000; k++) {
            const ld was = norms(n, 9, r.x);
            ok &= road_step(r.x, &r) || was > 36 + 2 * n;
            ok &= was <= 36 + 2 * n || norms(n, 9, r.x) <= was * (1 + 4 * EPS);
        }
        CHECK(ok);
        CHECK_BELOW(norms(n, 9, r.x), 36 + 2 * n);
    }
}

/* Problems with a known answer: the dominant subspace of a symmetric matrix, max tr(X A X^T) on Stiefel,
   and the lowest mode of a chain of masses and springs, min x^T K x on the manifold of the user. */
static void test_solves(void)
{
    enum { M = 8, K = 3, STEPS = 600 };
    static const roln_block subspace = {&roln_stiefel, K, M, 0}, shape = {&mode, 1, MASSES, 0};
    static const roln_real spectrum[M] = {ROLN_C(-0.5), ROLN_C(0.1), ROLN_C(0.3), ROLN_C(0.5), 1, 3, ROLN_C(3.5), 4};
    static const roln_real stiff[MASSES * MASSES] = {2, -1, 0, 0, -1, 2, -1, 0, 0, -1, 2, -1, 0, 0, -1, 1};
    roln_real Q[M * M], A[M * M], T[M * M], X[K * M], l[M], g[K * M], m[K * M], v, w, x[MASSES], work[ROLN_EIG_WORK(M) + M * M];
    uint64_t s = 9;
    roln_opt o = ROLN_OPT(0, 0);
    roln_adam a = {0, 0, 0};
    int k, i, j;
    CHECK(roln_stiefel_init(M, M, Q, &s, work) == ROLN_OK);
    for (i = 0; i < M * M; i++) T[i] = spectrum[i / M] * Q[i];
    memset(A, 0, sizeof A);
    roln_mm_at(M, M, M, Q, T, A);
    for (i = 0; i < M; i++)
        for (j = 0; j < i; j++) A[j * M + i] = A[i * M + j];
    CHECK(roln_eig(M, A, l, Q, work) == ROLN_OK);
    o.clip = 0, v = w = 0;
    memset(m, 0, sizeof m);
    CHECK(roln_stiefel_init(K, M, X, &s, owork) == ROLN_OK);
    for (k = 0; k < STEPS; k++) {
        roln_mm(K, M, M, X, A, g);
        for (i = 0; i < K * M; i++) g[i] = -g[i];
        o.lr[0] = ROLN_C(0.1) * roln_schedule((uint32_t)k, 0, STEPS, ROLN_C(0.05));
        CHECK(roln_adam_update(1, &subspace, &o, 1, g, X, &a, &(roln_moments){m, &v, &w}, owork) == ROLN_OK);
    }
    CHECK_BELOW(skewness(K, M, X), 6 * EPS);
    for (i = 0; i < K; i++) { /* nothing left outside the three eigenvectors */
        ld out = 0;
        for (j = 0; j < M - K; j++) {
            const ld d = (ld)roln_dot(M, X + i * M, Q + j * M);
            out += d * d;
        }
        CHECK_BELOW(sqrtl(out), PICK(2e-6, 1e-13));
    }

    for (i = 0; i < MASSES * MASSES; i++) T[i] = stiff[i] / ROLN_SQRT(mass[i / MASSES] * mass[i % MASSES]);
    CHECK(roln_eig(MASSES, T, l, T, work) == ROLN_OK);
    for (i = 0; i < MASSES; i++) x[i] = i == 0;
    memset(m, 0, sizeof m), memset(&a, 0, sizeof a), v = w = 0;
    for (k = 0; k < STEPS; k++) {
        roln_mm(1, MASSES, MASSES, x, stiff, g);
        o.lr[0] = ROLN_C(0.1) * roln_schedule((uint32_t)k, 0, STEPS, ROLN_C(0.05));
        CHECK(roln_adam_update(1, &shape, &o, 1, g, x, &a, &(roln_moments){m, &v, &w}, owork) == ROLN_OK);
        /* |grad|^2 in the metric of the masses at (1, 0, 0, 0): grad = (0, -1/3, 0, 0) */
        if (k == 0) CHECK_NEAR(v, (1 - (ld)o.beta2) / 3, 4 * EPS);
    }
    CHECK_NEAR(mode_inner(1, MASSES, x, x, x), 1, 8 * EPS);
    roln_mm(1, MASSES, MASSES, x, stiff, g);
    CHECK_NEAR(roln_dot(MASSES, x, g), l[0], PICK(1e-6, 1e-14));
    for (i = 0; i < MASSES; i++)
        CHECK_NEAR(ROLN_ABS(x[i]), ROLN_ABS(T[i]) / ROLN_SQRT(mass[i]), PICK(2e-6, 1e-13));
}

static void test_long_run(void)
{
    static const roln_block pair = {&roln_biorthogonal, 2, 4, 0};
    const roln_opt opt = {{ROLN_C(0.02), 0}, ROLN_C(0.9), ROLN_C(0.99), ROLN_C(1e-8), ROLN_C(0.1), 0};
    static roln_real x[16], g[16], m[16], v[1], w[1];
    roln_adam a = {0, 0, 0};
    uint64_t s = 7;
    ld moved = 0, top = 0;
    int k, i, ok = 1;
    point(2, 4, 0, &s, x);
    for (k = 0; k < 100000; k++) {
        for (i = 0; i < 16; i++) g[i] = roln_uniform(&s) - ROLN_C(0.5);
        ok &= roln_adam_update(1, &pair, &opt, 1, g, x, &a, &(roln_moments){m, v, w}, owork) == ROLN_OK;
        if (k % 100 == 99) {
            const ld d = defect(2, 4, x) / EPS;
            if (!(d <= top)) top = d;
            moved += (ld)ROLN_ABS(m[0]);
        }
    }
    CHECK(ok && moved > 1);
    WORST(11, top, 2);
}

static void test_schedule(void)
{
    uint32_t t;
    CHECK(roln_schedule(0, 4, 20, 0) == ROLN_C(0.25) && roln_schedule(2, 4, 20, 0) == ROLN_C(0.75) &&
          roln_schedule(3, 4, 20, 0) == 1);
    CHECK(roln_schedule(4, 4, 20, ROLN_C(0.5)) == 1 && roln_schedule(12, 4, 20, ROLN_C(0.5)) == ROLN_C(0.75));
    CHECK(roln_schedule(8, 4, 20, 0) == ROLN_C(0.84375)); /* x = 1/4: 1 - 3/16 + 2/64 */
    CHECK(roln_schedule(20, 4, 20, ROLN_C(0.125)) == ROLN_C(0.125) &&
          roln_schedule(UINT32_MAX, 4, 20, ROLN_C(0.125)) == ROLN_C(0.125));
    CHECK(roln_schedule(0, 0, 20, 0) == 1 && roln_schedule(0, 0, 0, ROLN_C(0.25)) == ROLN_C(0.25) &&
          roln_schedule(9, 9, 9, ROLN_C(0.5)) == ROLN_C(0.5));
    for (t = 0; t < 30; t++) {
        const roln_real a = roln_schedule(t, 4, 25, ROLN_C(0.1)), b = roln_schedule(t + 1, 4, 25, ROLN_C(0.1));
        CHECK(t < 4 ? b >= a : b <= a);
    }
}

void TEST_NAME(riem)(void)
{
    test_project();
    test_spd();
    test_stiefel();
    test_adam();
    test_failures();
    test_work();
    test_rooms();
    test_edge();
    test_back();
    test_outside();
    test_solves();
    test_long_run();
    test_schedule();
#ifdef ROLN_TEST_VERBOSE
    printf("riem " TEST_PRECISION ": tangent %.2Lf, orthogonal %.2Lf, normal %.2Lf, Sylvester %.2Lf, twin %.1Lf, idempotent %.2Lf, "
           "retract %.2Lf, constraint %.2Lf, rgrad %.2Lf, spd retract %.2Lf, adam %.0Lf, 100000 steps %.2Lf eps\n",
           worst[0], worst[1], worst[2], worst[3], worst[4], worst[5], worst[6], worst[7], worst[8], worst[9], worst[10],
           worst[11]);
    printf("riem " TEST_PRECISION ": Stiefel constraint %.2Lf, tangent %.2Lf, self-adjoint %.2Lf, idempotent %.2Lf, twin %.2Lf, "
           "retract %.2Lf, 10000 steps %.2Lf eps\n",
           worst[12], worst[13], worst[14], worst[15], worst[16], worst[17], worst[18]);
#endif
}
