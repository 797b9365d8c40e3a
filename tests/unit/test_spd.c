/* SPDX-License-Identifier: MIT */
/* SPD maps and their geometry (roln_spd.h, sections 7 and 8) against slow twins in long double, written from the
   definitions without eigenvectors: f_P(X) = f(X P^-1) P with f of a general matrix (Taylor and squaring for exp, Denman
   and Beavers for the root, roots and the series of atanh for log), derivatives from f of block triangular matrices (Mathias
   1996), backwards from central differences of order 8. Then the identities, degenerate inputs, statuses. */
#include "roln_spd.h"
#include "twin.h"

#include "room.h"

void TEST_NAME(spd)(void);

#define SN 6 /* largest n; the twins take 4 n */
#define SNN (SN * SN)

static const struct {
    int map;
    double p;
    const char *name;
} maps[] = {{ROLN_EXP, 0, "exp"},      {ROLN_LOG, 0, "log"},       {ROLN_POWER, 0.5, "sqrt"},   {ROLN_POWER, -0.5, "inverse sqrt"},
            {ROLN_POWER, -1, "inverse"}, {ROLN_POWER, 0, "power 0"}, {ROLN_POWER, 1, "power 1"},  {ROLN_POWER, 2, "power 2"},
            {ROLN_POWER, 0.3, "power 0.3"}, {ROLN_POWER, -1.7, "power -1.7"}, {ROLN_POWER, 1e-4, "power 1e-4"}};
enum { MAPS = (int)(sizeof maps / sizeof *maps) };

/* ---- twins ---- */

static void t_inverse(int n, const ld *a, ld *b)
{
    static ld t[TN * TN];
    int i;
    memcpy(t, a, (size_t)(n * n) * sizeof *t);
    for (i = 0; i < n * n; i++) b[i] = i % (n + 1) == 0;
    t_solve(n, n, t, b);
}

/* Y = X^1/2: Y <- (Y + Z^-1)/2, Z <- (Z + Y^-1)/2, from X and I */
static void t_root(int n, const ld *X, ld *Y)
{
    static ld Z[TN * TN], y[TN * TN], z[TN * TN];
    int i, k;
    memcpy(Y, X, (size_t)(n * n) * sizeof *Y);
    for (i = 0; i < n * n; i++) Z[i] = i % (n + 1) == 0;
    for (k = 0; k < 60; k++) {
        ld d = 0, m = 0;
        t_inverse(n, Y, y);
        t_inverse(n, Z, z);
        for (i = 0; i < n * n; i++) {
            const ld a = (Y[i] + z[i]) / 2;
            if (fabsl(a - Y[i]) > d) d = fabsl(a - Y[i]);
            if (fabsl(a) > m) m = fabsl(a);
            Y[i] = a;
            Z[i] = (Z[i] + y[i]) / 2;
        }
        if (d <= 2e-19L * m) break;
    }
}

/* Y = log X = 2^k 2 atanh((R - I)(R + I)^-1), R = X^(1/2^k) near I */
static void t_log(int n, const ld *X, ld *Y)
{
    static ld R[TN * TN], a[TN * TN], s[TN * TN], p[TN * TN];
    ld scale = 2, top;
    int i, k;
    memcpy(R, X, (size_t)(n * n) * sizeof *R);
    for (;;) {
        for (top = 0, i = 0; i < n * n; i++) top += fabsl(R[i] - (i % (n + 1) == 0));
        if (top < 0.5L) break;
        t_root(n, R, R);
        scale *= 2;
    }
    for (i = 0; i < n * n; i++) a[i] = R[i] + (i % (n + 1) == 0), s[i] = R[i] - (i % (n + 1) == 0);
    t_inverse(n, a, a);
    t_mul(n, s, a, s);
    for (i = 0; i < n * n; i++) Y[i] = 0, p[i] = s[i];
    t_mul(n, s, s, s);
    for (k = 1; k < 40; k += 2) {
        for (i = 0; i < n * n; i++) Y[i] += scale * p[i] / (ld)k;
        t_mul(n, p, s, p);
    }
}

/* Y = f(X), X a general matrix */
static void t_map(int n, int map, ld p, const ld *X, ld *Y)
{
    static ld t[TN * TN];
    int i;
    if (map == ROLN_EXP) t_exp(n, X, Y);
    else if (map == ROLN_LOG) t_log(n, X, Y);
    else if (p == 0.5L) t_root(n, X, Y);
    else if (p == -0.5L) t_root(n, X, t), t_inverse(n, t, Y);
    else if (p == -1) t_inverse(n, X, Y);
    else if (p == 1) memcpy(Y, X, (size_t)(n * n) * sizeof *Y);
    else if (p == 2) t_mul(n, X, X, Y);
    else {
        t_log(n, X, t);
        for (i = 0; i < n * n; i++) t[i] *= p;
        t_exp(n, t, Y);
    }
}

/* X P^-1, N = n or, on the block diagonal of X, a multiple of n; and X P */
static void t_over(int n, const ld *X, const ld *P, ld *Y)
{
    static ld r[TN * TN];
    t_inverse(n, P, r);
    t_mul(n, X, r, Y);
}

/* f_P(X) = f(X P^-1) P */
static void t_map_at(int n, int map, ld p, const ld *P, const ld *X, ld *Y)
{
    static ld t[TN * TN];
    t_over(n, X, P, t);
    t_map(n, map, p, t, Y);
    t_mul(n, Y, P, Y);
}

static ld t_dot(int n, const ld *a, const ld *b)
{
    ld s = 0;
    int i;
    for (i = 0; i < n; i++) s += a[i] * b[i];
    return s;
}

/* What a scalar under test depends on, and the scalar by its definition; every matrix is made symmetric first. */
enum { MAP, DIST };
typedef struct {
    int what, n, map;
    ld p, P[SNN], X[SNN], U[SNN], G[SNN];
} t_case;

static const ld *t_sym(int n, const ld *a, ld *s)
{
    int i;
    for (i = 0; i < n * n; i++) s[i] = (a[i] + a[i % n * n + i / n]) / 2;
    return s;
}

static ld t_value(void *ctx)
{
    const t_case *c = (const t_case *)ctx;
    static ld P[SNN], X[SNN], a[SNN], b[SNN];
    const int n = c->n;
    int i;
    t_sym(n, c->P, P);
    t_sym(n, c->X, X);
    if (c->what == DIST) { /* half of tr(log(X P^-1)^2) */
        t_over(n, X, P, a), t_log(n, a, b), t_mul(n, b, b, a);
        for (i = 1; i < n; i++) a[0] += a[i * (n + 1)];
        return c->G[0] * a[0] / 2;
    }
    t_map_at(n, c->map, c->p, P, X, a);
    return t_dot(n * n, c->G, a);
}

/* ---- matrices ---- */

static void random_sym(int n, double scale, uint64_t *s, roln_real *a)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) a[i * n + j] = a[j * n + i] = (roln_real)(scale * 0.98765432109876543) * roln_normal(s);
}

/* Y = T X T^T, symmetric to the bit */
static void congruence(int n, const roln_real *T, const roln_real *X, roln_real *Y)
{
    roln_real t[SNN];
    int i, j;
    roln_congr(n, T, X, Y, t);
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++) Y[i * n + j] = Y[j * n + i];
}

/* SPD in random directions, eigenvalues by kind: spread, all equal, gaps of 1e-7, one double and gaps 1e-3 .. 1, one pair
   across each switch of formulas (factor 2; p log = 1), over 3 decades. */
enum { KINDS = 6 };
static void random_spd(int n, int kind, uint64_t *s, roln_real *X)
{
    static const double gap[SN] = {0, 0, 1e-3, 0.03, 0.3, 1};
    roln_real A[SNN], Q[SNN], D[SNN], l[SN], w[ROLN_EIG_WORK(SN)];
    int i;
    random_sym(n, 1, s, A);
    CHECK(roln_eig(n, A, l, Q, w) == ROLN_OK);
    memset(D, 0, sizeof D);
    for (i = 0; i < n; i++) {
        const double u = (double)roln_uniform(s);
        D[i * (n + 1)] = (roln_real)(kind == 0   ? 0.5 + 2.5 * u
                                     : kind == 1 ? 1.7
                                     : kind == 2 ? 1 + 1e-7 * i
                                     : kind == 3 ? 1 + gap[i]
                                     : kind == 4 ? ldexp(1 + 1e-3 * u, i / 2)
                                                 : pow(10, 3 * u - 1.5));
    }
    for (i = 0; i < n * n; i++) A[i] = Q[i % n * n + i / n];
    congruence(n, A, D, X);
}

static ld smallest(int n, const roln_real *X)
{
    roln_real l[SN], Q[SNN], w[ROLN_EIG_WORK(SN)];
    CHECK(roln_eig(n, X, l, Q, w) == ROLN_OK);
    return (ld)l[0];
}

/* Condition of an SPD matrix, for error bounds. */
static ld condition(int n, const roln_real *X)
{
    roln_real l[SN], Q[SNN], w[ROLN_EIG_WORK(SN)];
    CHECK(roln_eig(n, X, l, Q, w) == ROLN_OK);
    return (ld)l[n - 1] / (ld)l[0];
}

/* largest |a - b| over largest |b| or, if larger, floor */
static ld relative(int n, const roln_real *a, const ld *b, ld floor)
{
    ld d = 0, m = floor;
    int i;
    for (i = 0; i < n; i++) {
        if (!roln_finite(a[i])) return 1e30L;
        if (fabsl((ld)a[i] - b[i]) > d) d = fabsl((ld)a[i] - b[i]);
        if (fabsl(b[i]) > m) m = fabsl(b[i]);
    }
    return d > 0 ? d / m : 0;
}

static ld apart(int n, const roln_real *a, const roln_real *b)
{
    static ld t[SNN];
    widen(n, b, t);
    return relative(n, a, t, 0);
}

/* g against differences of t_value in the matrices x, relative to 1 at least, the size of the cotangents. The step is small
   beside the smallest eigenvalue lmin, as far as derivatives grow with its inverse. */
static ld gradient(int n, const roln_real *g, ld *x, ld lmin, t_case *c)
{
    static ld ref[SNN];
    int i;
    for (i = 0; i < n; i++) ref[i] = t_slope(t_value, c, x + i, 4e-3L * lmin);
    return relative(n, g, ref, 1);
}

static int symmetric(int n, const roln_real *a)
{
    int i, ok = 1;
    for (i = 0; i < n * n; i++) ok &= a[i] == a[i % n * n + i / n];
    return ok;
}

static void identity(int n, roln_real *a)
{
    int i;
    for (i = 0; i < n * n; i++) a[i] = i % (n + 1) == 0;
}

/* ---- values and divided differences of f ---- */

/* x^p within |p log x| 2^-64, which powl would take six times as long for */
static ld t_raised(ld x, ld p)
{
    return expl(p * logl(x));
}

/* f[a, b] in long double; close: 8-point Gauss quadrature of f' over [a, b], exact to 1e-20 for a ratio below 1.3 */
static ld t_f(int map, ld p, ld x, int derivative)
{
    if (map == ROLN_LOG) return derivative ? 1 / x : logl(x);
    return derivative ? p * t_raised(x, p - 1) : t_raised(x, p);
}

static ld t_dd1(int map, ld p, ld a, ld b)
{
    static const ld x[4] = {0.18343464249564980494L, 0.52553240991632898582L, 0.79666647741362673959L, 0.96028985649753623168L};
    static const ld w[4] = {0.36268378337836198297L, 0.31370664587788728734L, 0.22238103445337447054L, 0.10122853629037625915L};
    ld sum = 0;
    int k;
    if (a / b > 1.3L || b / a > 1.3L)
        return map == ROLN_LOG ? logl(a / b) / (a - b) : t_raised(b, p) * expm1l(p * logl(a / b)) / (a - b);
    for (k = 0; k < 4; k++)
        sum += w[k] * (t_f(map, p, (a + b) / 2 + x[k] * (a - b) / 2, 1) + t_f(map, p, (a + b) / 2 - x[k] * (a - b) / 2, 1)) / 2;
    return sum;
}

static void test_differences(void)
{
    static const double gap[] = {0, 1e-9, 2e-7, 1e-5, 1e-3, 0.03, 0.3, 0.9, 0.99999, 1, 1.00001, 1.3, 3, 20, 1e3, 1e5};
    static const double at[] = {1e-12, 1e-3, 0.3, 0.7, 1, 1.9, 40, 1e7};
    int m, i, j, a, b;
    for (m = 1; m < MAPS; m++) {
        const ld p = (ld)(roln_real)maps[m].p;
        static char names[MAPS][2][40];
        sprintf(names[m][0], "f,  %s, ulp / (1 + |p log l|)", maps[m].name);
        sprintf(names[m][1], "K,  %s, ulp / (1 + |p log l|)", maps[m].name);
        for (a = 0; a < (int)(sizeof at / sizeof *at); a++)
            for (b = 0; b < (int)(sizeof gap / sizeof *gap); b++) {
                roln_real l[2], f[2], K[4];
                ld unit;
                l[0] = (roln_real)at[a];
                l[1] = (roln_real)(at[a] * (1 + gap[b]));
                CHECK(roln_map_values(2, maps[m].map, (roln_real)p, l, f) == ROLN_OK);
                roln_map_dd1(2, maps[m].map, (roln_real)p, l, f, K);
                CHECK(K[1] == K[2]);
                for (i = 0; i < 2; i++) {
                    const ld r = t_f(maps[m].map, p, (ld)l[i], 0);
                    /* the special exponents neither use log nor grow with it; log itself is within 2 ulp */
                    unit = maps[m].map == ROLN_POWER && fabsl(p) < 2 && p != 1 && fabsl(p) != 0.5L && p != 0 && p != -1
                               ? 1 + fabsl(p * logl((ld)l[i])) : 1;
                    BOUND(names[m][0], r == 0 ? fabsl((ld)f[i]) : fabsl((ld)f[i] / r - 1) / (EPS * unit), 2);
                    for (j = 0; j < 2; j++) {
                        const ld k = t_dd1(maps[m].map, p, (ld)l[i], (ld)l[j]);
                        BOUND(names[m][1], k == 0 ? fabsl((ld)K[i * 2 + j]) : fabsl((ld)K[i * 2 + j] / k - 1) / (EPS * unit), 4);
                    }
                }
            }
    }
}

/* ---- section 7 ---- */

/* One map at one X and P, random E and G; value: by the twin; Y by the library; Z and gX, gP are free. */
static struct {
    int n, map;
    roln_real p, *P, *A, *X, *E, *G, *V, *W, *K, *l, *f, *Y, *Z, *gX, *gP;
    const roln_real *base; /* A, or NULL for P = I */
    t_case c;
    ld value[SNN], tol, hX, hP; /* tol: what n eps makes of the map; widths of differences */
} one;

/* kind of the eigenvalues in the frame */
static void one_map(int n, int based, int m, int kind, uint64_t *s)
{
    const int map = maps[m].map, nn = n * n, chain = map == ROLN_LOG || (map == ROLN_POWER && maps[m].p < 1);
    t_case *c = &one.c;
    ld kf;
    one.n = n, one.map = map, one.p = (roln_real)maps[m].p;
    one.P = fresh(nn), one.A = fresh(nn), one.X = fresh(nn), one.E = fresh(nn), one.G = fresh(nn);
    one.V = fresh(nn), one.W = fresh(nn), one.K = fresh(nn), one.l = fresh(n), one.f = fresh(n);
    one.Y = fresh(nn), one.Z = fresh(nn), one.gX = zeros(nn), one.gP = zeros(nn);
    one.base = based ? one.A : NULL;

    random_spd(n, kind, s, one.X);
    if (map == ROLN_EXP) random_sym(n, kind == 1 ? 0 : 0.2 * kind, s, one.X);
    identity(n, one.P);
    if (based) {
        random_spd(n, 0, s, one.P);
        CHECK(roln_chol(n, one.P, one.A) == ROLN_OK);
        congruence(n, one.A, one.X, one.X);
    }
    random_sym(n, 1, s, one.E);
    random_sym(n, 1, s, one.G);
    c->what = MAP, c->n = n, c->map = map, c->p = (ld)one.p;
    widen(nn, one.P, c->P), widen(nn, one.X, c->X), widen(nn, one.E, c->U), widen(nn, one.G, c->G);

    /* Rounding in the frame, n eps |S| kappa(P), moves f by that times f' in the smallest eigenvalue, hence kappa(S) where f'
       falls: kf; and K likewise, f'' / f'. */
    one.hX = map == ROLN_EXP ? 1 : smallest(n, one.X), one.hP = smallest(n, one.P);
    kf = (chain && map != ROLN_EXP ? condition(n, one.X) : 1) * (based ? condition(n, one.P) : 1);
    if (map == ROLN_POWER && one.p < 0) kf *= 2;
    one.tol = (ld)n * EPS * kf;
}

static void check_map_value(void)
{
    const int n = one.n, nn = n * n;
    CHECK(roln_spd_frame(n, one.base, one.X, one.l, one.V, one.W, fresh(ROLN_SPD_FRAME_WORK(n))) == ROLN_OK);
    CHECK(roln_map_values(n, one.map, one.p, one.l, one.f) == ROLN_OK);
    roln_map_dd1(n, one.map, one.p, one.l, one.f, one.K);
    roln_spd_form(n, one.f, one.V, one.Y, fresh(ROLN_SPD_FORM_WORK(n)));
    CHECK(symmetric(n, one.Y));
    CHECK(roln_spd_map(n, one.map, one.p, one.base, one.X, one.Z, fresh(ROLN_SPD_MAP_WORK(n))) == ROLN_OK);
    CHECK(same(nn, one.Y, one.Z));
    memcpy(one.Z, one.X, (size_t)nn * sizeof *one.Z);
    CHECK(roln_spd_map(n, one.map, one.p, one.base, one.Z, one.Z, fresh(ROLN_SPD_MAP_WORK(n))) == ROLN_OK);
    CHECK(same(nn, one.Y, one.Z));
    t_map_at(n, one.map, (ld)one.p, one.c.P, one.c.X, one.value);
    BOUND("map: value, n eps kappa", relative(nn, one.Y, one.value, 1) / one.tol, 8);
}

/* The matrix and, where it has one, its inverse times a vector; in place. */
static void check_map_mul(void)
{
    static ld t[SNN], g[SNN];
    const int n = one.n, nn = n * n;
    roln_real *x = fresh(n), *y = fresh(n), *f = one.f;
    int i, j;
    for (i = 0; i < n; i++) x[i] = one.E[i];
    roln_spd_mul(n, f, one.V, x, y, fresh(n));
    for (i = 0; i < n; i++)
        for (t[i] = 0, j = 0; j < n; j++) t[i] += one.value[i * n + j] * one.c.U[j];
    BOUND("map: times a vector, n eps kappa", relative(n, y, t, 1) / one.tol, 16);
    roln_spd_mul(n, f, one.V, x, x, fresh(n));
    CHECK(same(n, x, y));
    if (one.map == ROLN_LOG) return;
    for (i = 0; i < n; i++) f[i] = 1 / f[i];
    roln_spd_form(n, f, one.W, one.Z, fresh(ROLN_SPD_FORM_WORK(n)));
    for (i = 0; i < n; i++) f[i] = 1 / f[i];
    t_inverse(n, one.value, t);
    widen(nn, one.Z, g);
    t_mul(n, g, one.value, g);
    for (i = 0; i < nn; i++) CHECK_NEAR(g[i], i % (n + 1) == 0, 16 * one.tol * condition(n, one.Y));
}

/* Derivative: f [X E; 0 X] = [., D; 0 .], right-multiplied. */
static void check_map_d(void)
{
    static ld B[TN * TN], t[TN * TN], r[SNN], d[SNN];
    const int n = one.n, nn = n * n, N = 2 * n;
    roln_real *D = fresh(nn);
    int i, j;
    t_over(n, one.c.X, one.c.P, r);
    t_over(n, one.c.U, one.c.P, d);
    for (i = 0; i < N * N; i++) B[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            B[i * N + j] = B[(i + n) * N + j + n] = r[i * n + j];
            B[i * N + j + n] = d[i * n + j];
        }
    t_map(N, one.map, (ld)one.p, B, t);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) d[i * n + j] = t[i * N + j + n];
    t_mul(n, d, one.c.P, d);
    roln_spd_map_d(n, one.K, one.V, one.W, one.E, D, fresh(ROLN_SPD_MAP_D_WORK(n)));
    BOUND("map: derivative, n eps kappa", relative(nn, D, d, 1) / one.tol, 16);
    if (!one.base) { /* P = I: the derivative is its own adjoint */
        roln_spd_map_d(n, one.K, one.V, one.W, one.G, D, fresh(ROLN_SPD_MAP_D_WORK(n)));
        CHECK_BELOW(apart(nn, one.gX, D), 4 * (ld)n * EPS);
    }
}

/* Backward: both add; gX does not depend on whether gP is wanted. */
static void check_map_bwd(void)
{
    const int n = one.n, nn = n * n;
    roln_real *K = one.K, *V = one.V, *W = one.W, *l = one.l, *f = one.f, *gX = one.gX, *gP = one.gP, *Z = one.Z;
    int i;
    roln_spd_map_bwd(n, l, f, K, V, W, one.G, gX, gP, fresh(ROLN_SPD_MAP_BWD_WORK(n)));
    BOUND("map: backward in X, n eps kappa", gradient(nn, gX, one.c.X, one.hX, &one.c) / one.tol, 32);
    BOUND("map: backward in P, n eps kappa", gradient(nn, gP, one.c.P, one.hP, &one.c) / one.tol, 32);
    memcpy(Z, gX, (size_t)nn * sizeof *Z);
    roln_spd_map_bwd(n, l, f, K, V, W, one.G, gX, gP, fresh(ROLN_SPD_MAP_BWD_WORK(n)));
    for (i = 0; i < nn; i++) CHECK_NEAR(gX[i], 2 * Z[i], (ld)n * n * EPS * (fabsl((ld)Z[i]) + 30));
    memset(gX, 0, (size_t)nn * sizeof *gX);
    roln_spd_map_bwd(n, l, f, K, V, W, one.G, gX, NULL, fresh(ROLN_SPD_MAP_BWD_WORK(n)));
    CHECK(same(nn, gX, Z));
}

static void check_map(int n, int based, int m, int kind, uint64_t *s)
{
    one_map(n, based, m, kind, s);
    check_map_value();
    check_map_mul();
    check_map_bwd();
    check_map_d(); /* compares gX */
    fresh_done();
}

/* D2 exp_P(U)[E, F] = V^T d2(W E W^T, W F W^T) V, d2 = roln_exp_d2. */
static void exp_d2(int n, const roln_real *K3, const roln_real *V, const roln_real *W, const roln_real *E, const roln_real *F,
                   roln_real *D)
{
    roln_real e[SNN], f[SNN], d[SNN], t[SNN];
    int i;
    roln_congr(n, W, E, e, t);
    roln_congr(n, W, F, f, t);
    for (i = 0; i < n * n; i++) d[i] = D[i] = 0;
    roln_exp_d2(n, K3, e, f, d);
    roln_congr_t(n, V, d, D, t);
}

/* Second derivative of exp at P: the corner of exp [U E F 0; . U 0 F; . . U E; . . . U], each right-multiplied by P^-1. */
static void check_exp_d2(int n, int based, ld scale, uint64_t *s)
{
    static ld u[SNN], e[SNN], f[SNN], p[SNN], B[TN * TN], t[TN * TN], r[SNN];
    const int nn = n * n, N = 4 * n;
    roln_real *P = fresh(nn), *A = fresh(nn), *U = fresh(nn), *E = fresh(nn), *F = fresh(nn), *G = fresh(nn), *D = fresh(nn);
    roln_real *X = fresh(nn);
    roln_real *V = fresh(nn), *W = fresh(nn), *K = fresh(nn), *T = fresh(n * nn), *l = fresh(n);
    ld a = 0, b = 0, size = 0, tol;
    int i, j, k;
    random_sym(n, (double)scale, s, U);
    random_sym(n, 1, s, E);
    random_sym(n, 1, s, F);
    random_sym(n, 1, s, G);
    identity(n, P);
    if (based) random_spd(n, 0, s, P);
    CHECK(roln_chol(n, P, A) == ROLN_OK);
    CHECK(roln_spd_frame(n, based ? A : NULL, U, l, V, W, fresh(ROLN_SPD_FRAME_WORK(n))) == ROLN_OK);
    roln_exp_dd1(n, l, K);
    roln_exp_dd2(n, l, K, T);
    widen(nn, P, p), widen(nn, U, u), widen(nn, E, e), widen(nn, F, f);
    t_over(n, u, p, u), t_over(n, e, p, e), t_over(n, f, p, f);
    for (i = 0; i < N * N; i++) B[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            for (k = 0; k < 4; k++) B[(i + k * n) * N + j + k * n] = u[i * n + j];
            B[i * N + j + n] = B[(i + 2 * n) * N + j + 3 * n] = e[i * n + j];
            B[i * N + j + 2 * n] = B[(i + n) * N + j + 3 * n] = f[i * n + j];
        }
    t_exp(N, B, t);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) r[i * n + j] = t[i * N + j + 3 * n];
    t_mul(n, r, p, r);
    tol = (ld)n * EPS * (based ? condition(n, P) : 1);
    exp_d2(n, T, V, W, E, F, D);
    BOUND("exp: second derivative, n eps kappa", relative(nn, D, r, 0.1L) / tol, 16);

    /* eigenbasis: <G, D2[E,F]> = <F, D2[E,G]>; the increment adds and is symmetric to the bit */
    for (i = 0; i < nn; i++) D[i] = X[i] = 0;
    roln_exp_d2(n, T, E, F, D);
    roln_exp_d2(n, T, E, G, X);
    for (i = 0; i < nn; i++) {
        a += (ld)G[i] * (ld)D[i], b += (ld)F[i] * (ld)X[i];
        size += fabsl((ld)G[i] * (ld)D[i]);
    }
    CHECK(symmetric(n, D));
    CHECK_NEAR(a / size, b / size, 4 * tol);
    memcpy(X, D, (size_t)nn * sizeof *X);
    roln_exp_d2(n, T, E, F, D);
    for (i = 0; i < nn; i++) CHECK_NEAR(D[i], 2 * X[i], 4 * EPS * (ld)ROLN_ABS(X[i]) + tol * size / (ld)nn);
    fresh_done();
}

/* The accuracy that stands at roln_spd_map, for conditions up to the one that is refused: eigenvalues graded, one small, one
   large, in random directions; f of the matrix by Jacobi. */
static void check_accuracy(int n, int map, double p, double power, int kind, uint64_t *s)
{
    enum { N = 16 };
    static roln_real X[N * N], V[N * N], Y[N * N], l[N], w[ROLN_SPD_MAP_WORK(N)];
    static ld a[N * N], v[N * N];
    const ld kappa = powl(0.98L / ((ld)n * EPS), (ld)power); /* power 1: the limit */
    ld want[N];
    ld top = 0, f = 0, slope = 0, err = 0;
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) X[i * n + j] = X[j * n + i] = roln_normal(s);
    CHECK(roln_eig(n, X, l, V, w) == ROLN_OK);
    for (k = 0; k < n; k++) {
        const ld e = kind == 0 ? (ld)k / (n - 1) : kind == 1 ? k == n - 1 : k > 0;
        want[k] = map == ROLN_EXP ? (ld)power * (7 - 14 * e) : powl(kappa, -e);
    }
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            ld sum = 0;
            for (k = 0; k < n; k++) sum += want[k] * (ld)V[k * n + i] * (ld)V[k * n + j];
            X[i * n + j] = X[j * n + i] = (roln_real)sum;
        }
    if (roln_spd_map(n, map, (roln_real)p, NULL, X, Y, w) != ROLN_OK) { /* rounding of X moved it beyond the limit */
        CHECK(power > 0.95);
        return;
    }
    widen(n * n, X, a);
    t_jacobi(n, a, v);
    for (k = 0; k < n; k++) {
        const ld x = a[k * n + k];
        top = fmaxl(top, fabsl(x));
        f = fmaxl(f, fabsl(map == ROLN_EXP ? expl(x) : t_f(map, (ld)(roln_real)p, x, 0)));
        slope = fmaxl(slope, fabsl(map == ROLN_EXP ? expl(x) : t_f(map, (ld)(roln_real)p, x, 1)));
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            ld x = 0;
            for (k = 0; k < n; k++)
                x += v[i * n + k] * v[j * n + k] *
                     (map == ROLN_EXP ? expl(a[k * n + k]) : t_f(map, (ld)(roln_real)p, a[k * n + k], 0));
            err = fmaxl(err, fabsl(x - (ld)Y[i * n + j]));
        }
    BOUND("map: accuracy by condition", err / ((ld)n * EPS * (top * slope + f)), 3);
}

/* exp log = id, log_P exp_P = id, root^2 = X, powers add, the ends of a geodesic, f_P(X)^-1 = f_{P^-1}(X^-1) */
static void check_map_identities(int n, int kind, uint64_t *s)
{
    roln_real P[SNN], A[SNN], X[SNN], Y[SNN], Z[SNN], w[ROLN_SPD_MAP_WORK(SN)], t[SNN];
    static ld small[SNN];
    const int nn = n * n;
    ld tol;
    int i;
    random_spd(n, 0, s, P);
    random_spd(n, kind, s, X);
    CHECK(roln_chol(n, P, A) == ROLN_OK);
    tol = 8 * (ld)n * EPS * condition(n, X) * condition(n, P); /* of each map, see check_map */
    CHECK(roln_spd_map(n, ROLN_LOG, 0, NULL, X, Y, w) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_EXP, 0, NULL, Y, Y, w) == ROLN_OK);
    CHECK_BELOW(apart(nn, Y, X), tol);
    CHECK(roln_spd_map(n, ROLN_LOG, 0, A, X, Y, w) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_EXP, 0, A, Y, Z, w) == ROLN_OK);
    CHECK_BELOW(apart(nn, Z, X), tol);
    random_sym(n, 0.7, s, Y);
    Y[0] += Y[0] < 0 ? ROLN_C(-0.5) : ROLN_C(0.5); /* the error is relative to Y, and the map turns about 1 */
    CHECK(roln_spd_map(n, ROLN_EXP, 0, A, Y, Z, w) == ROLN_OK);
    tol *= condition(n, Z);
    CHECK(roln_spd_map(n, ROLN_LOG, 0, A, Z, Z, w) == ROLN_OK);
    CHECK_BELOW(apart(nn, Z, Y), tol);
    for (i = 0; i < nn; i++) Y[i] /= 1024; /* near 0 the error is relative to 1 */
    CHECK(roln_spd_map(n, ROLN_EXP, 0, A, Y, Z, w) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_LOG, 0, A, Z, Z, w) == ROLN_OK);
    widen(nn, Y, small);
    CHECK_BELOW(relative(nn, Z, small, 1), tol);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.5), NULL, X, Y, w) == ROLN_OK);
    roln_mm(n, n, n, Y, Y, Z);
    CHECK_BELOW(apart(nn, Z, X), tol);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(-0.5), NULL, X, Y, w) == ROLN_OK);
    congruence(n, Y, X, Z);
    identity(n, Y);
    CHECK_BELOW(apart(nn, Z, Y), tol);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.3), NULL, X, Y, w) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.9), NULL, X, Z, w) == ROLN_OK);
    roln_mm(n, n, n, Y, Z, t);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(1.2), NULL, X, Z, w) == ROLN_OK);
    CHECK_BELOW(apart(nn, t, Z), tol);
    for (i = 0; i <= 1; i++) { /* ends */
        CHECK(roln_spd_map(n, ROLN_POWER, (roln_real)i, A, X, Y, w) == ROLN_OK);
        CHECK_BELOW(apart(nn, Y, i ? X : P), 8 * (ld)n * EPS * condition(n, P));
    }
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.3), A, X, Y, w) == ROLN_OK); /* P #_t X = X #_{1-t} P */
    CHECK(roln_chol(n, X, A) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.7), A, P, Z, w) == ROLN_OK);
    CHECK_BELOW(apart(nn, Z, Y), tol);
}

/* ---- section 8 ---- */

/* Distance against the twin: |log of l| moves by the rounding of S over l. */
static void check_dist(int n, int based, int kind, uint64_t *s)
{
    const int nn = n * n;
    roln_real *P = fresh(nn), *A = fresh(nn), *X = fresh(nn), d = 7;
    static t_case c;
    ld tol;
    int i;
    identity(n, P);
    if (based) random_spd(n, 0, s, P);
    CHECK(roln_chol(n, P, A) == ROLN_OK);
    random_spd(n, kind, s, X);
    if (kind == 1) for (i = 0; i < nn; i++) X[i] = ROLN_C(1.7) * P[i]; /* all eigenvalues of the frame equal */
    c.what = DIST, c.n = n, c.G[0] = 1;
    widen(nn, P, c.P), widen(nn, X, c.X);
    tol = (ld)n * EPS * condition(n, P) * condition(n, X);
    CHECK(roln_spd_dist(n, based ? A : NULL, X, &d, fresh(ROLN_SPD_DIST_WORK(n))) == ROLN_OK);
    BOUND("dist, n eps kappa", fabsl((ld)d - sqrtl(2 * t_value(&c))) / tol, 4);
    fresh_done();
}

/* dist(P, P #_t X) = t dist, invariance under congruence and inversion, symmetry, d(P, P) = 0 */
static void check_distances(int n, uint64_t *s)
{
    roln_real P[SNN], A[SNN], X[SNN], Y[SNN], T[SNN], Z[SNN], w[ROLN_SPD_MAP_WORK(SN)], d, x;
    ld tol;
    int i;
    random_spd(n, 0, s, P);
    random_spd(n, 0, s, X);
    random_sym(n, 1, s, T);
    for (i = 0; i < n; i++) T[i * (n + 1)] += (roln_real)(T[i * (n + 1)] < 0 ? -2 : 2), T[i] += ROLN_C(0.5); /* not symmetric */
    tol = 8 * (ld)n * EPS * condition(n, P) * condition(n, X);
    CHECK(roln_chol(n, P, A) == ROLN_OK);
    CHECK(roln_spd_dist(n, A, X, &d, w) == ROLN_OK);
    CHECK(roln_spd_dist(n, A, P, &x, w) == ROLN_OK);
    CHECK_BELOW(x, tol);
    CHECK(roln_spd_map(n, ROLN_POWER, ROLN_C(0.3), A, X, Y, w) == ROLN_OK);
    CHECK(roln_spd_dist(n, A, Y, &x, w) == ROLN_OK);
    CHECK_NEAR(x, 0.3L * (ld)d, tol);
    CHECK(roln_chol(n, X, Y) == ROLN_OK);
    CHECK(roln_spd_dist(n, Y, P, &x, w) == ROLN_OK);
    CHECK_NEAR(x, d, tol);
    congruence(n, T, P, Y);
    congruence(n, T, X, Z);
    tol *= condition(n, Y);
    CHECK(roln_chol(n, Y, Y) == ROLN_OK);
    CHECK(roln_spd_dist(n, Y, Z, &x, w) == ROLN_OK);
    CHECK_NEAR(x, d, tol);
    CHECK(roln_spd_map(n, ROLN_POWER, -1, NULL, P, Y, w) == ROLN_OK);
    CHECK(roln_spd_map(n, ROLN_POWER, -1, NULL, X, Z, w) == ROLN_OK);
    CHECK(roln_chol(n, Y, Y) == ROLN_OK);
    CHECK(roln_spd_dist(n, Y, Z, &x, w) == ROLN_OK);
    CHECK_NEAR(x, d, tol);
}

/* ---- scratch: what is declared is what is written ---- */

static void check_rooms(int n, uint64_t *s)
{
    roln_real P[SNN], A[SNN], X[SNN], U[SNN], G[SNN], Y[SNN], V[SNN], W[SNN], K[SNN], l[SN], f[SN];
    roln_real gX[SNN] = {0}, gP[SNN] = {0}, d;
    random_spd(n, 0, s, P);
    random_spd(n, 0, s, X);
    random_sym(n, 1, s, U);
    random_sym(n, 1, s, G);
    CHECK(roln_chol(n, P, A) == ROLN_OK);
    roln_congr(n, A, X, Y, room_of(ROLN_CONGR_WORK(n)));
    CHECK_ROOM();
    roln_congr_t(n, A, X, Y, room_of(ROLN_CONGR_WORK(n)));
    CHECK_ROOM();
    CHECK(roln_inv(n, P, Y, room_of(ROLN_INV_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
    CHECK(roln_eig(n, P, l, Y, room_of(ROLN_EIG_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
    CHECK(roln_spd_frame(n, A, X, l, V, W, room_of(ROLN_SPD_FRAME_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
    CHECK(roln_map_values(n, ROLN_LOG, 0, l, f) == ROLN_OK);
    roln_map_dd1(n, ROLN_LOG, 0, l, f, K);
    roln_spd_form(n, f, V, Y, room_of(ROLN_SPD_FORM_WORK(n)));
    CHECK_ROOM();
    roln_spd_mul(n, f, V, f, f, room_of(n));
    CHECK_ROOM();
    CHECK(roln_spd_map(n, ROLN_LOG, 0, A, X, Y, room_of(ROLN_SPD_MAP_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
    roln_spd_map_d(n, K, V, W, U, Y, room_of(ROLN_SPD_MAP_D_WORK(n)));
    CHECK_ROOM();
    roln_spd_map_bwd(n, l, f, K, V, W, G, gX, gP, room_of(ROLN_SPD_MAP_BWD_WORK(n)));
    CHECK_ROOM();
    CHECK(roln_spd_dist(n, A, X, &d, room_of(ROLN_SPD_DIST_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
}

/* ---- statuses: outputs stay as they are ---- */

static const roln_real unit[4] = {1, 0, 0, 1}, large[4] = {50, 0, 0, 50};
static const roln_real sevens[8] = {7, 7, 7, 7, 7, 7, 7, 7};
static const roln_real huge = ROLN_EPS < ROLN_C(1e-10) ? (roln_real)1e200 : (roln_real)1e30;
enum { STATUS_WORK = ROLN_SPD_FRAME_WORK(2) + ROLN_SPD_MAP_WORK(2) };
#define REFUSED(call, status) CHECK((call) == (status) && same(8, Y, sevens))

/* Matrices with an eigenvalue of zero or below. */
static void check_not_spd(void)
{
    static const roln_real bad[4][4] = {{1, 0, 0, 0}, {1, 1, 1, 1}, {1, 2, 2, 1}, {-1, 0, 0, -2}};
    roln_real Y[8], w[STATUS_WORK];
    int i;
    memcpy(Y, sevens, sizeof Y);
    for (i = 0; i < 4; i++) {
        REFUSED(roln_spd_map(2, ROLN_LOG, 0, NULL, bad[i], Y, w), ROLN_E_NOT_SPD);
        REFUSED(roln_spd_map(2, ROLN_POWER, ROLN_C(0.5), unit, bad[i], Y, w), ROLN_E_NOT_SPD);
        REFUSED(roln_spd_map(2, ROLN_POWER, 2, unit, bad[i], Y, w), ROLN_E_NOT_SPD);
        REFUSED(roln_spd_dist(2, unit, bad[i], Y, w), ROLN_E_NOT_SPD);
    }
}

/* NaN and infinities, a base point that is none, results that overflow. */
static void check_not_finite(void)
{
    static const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    roln_real X[8], Y[8], w[STATUS_WORK];
    int i;
    memcpy(Y, sevens, sizeof Y);
    for (i = 0; i < 12; i++) {
        memcpy(X, unit, sizeof unit), memcpy(X + 4, unit, sizeof unit);
        X[i % 4] = bad[i / 4];
        X[i % 4 % 2 * 2 + i % 4 / 2] = X[i % 4];
        REFUSED(roln_spd_map(2, ROLN_EXP, 0, NULL, X, Y, w), ROLN_E_NOT_FINITE);
        REFUSED(roln_spd_map(2, ROLN_LOG, 0, unit, X, Y, w), ROLN_E_NOT_FINITE);
        REFUSED(roln_spd_frame(2, unit, X, Y, Y + 4, Y, w), ROLN_E_NOT_FINITE);
        REFUSED(roln_spd_dist(2, NULL, X, Y, w), ROLN_E_NOT_FINITE);
    }
    X[0] = 0, X[1] = X[2] = 0, X[3] = 1; /* a base point that is none */
    REFUSED(roln_spd_map(2, ROLN_LOG, 0, X, unit, Y, w), ROLN_E_NOT_FINITE);
    REFUSED(roln_spd_map(2, ROLN_EXP, 0, NULL, large, Y, w), ROLN_E_RANGE);
    for (i = 0; i < 4; i++) X[i] = huge * unit[i];
    REFUSED(roln_spd_map(2, ROLN_POWER, 2, NULL, X, Y, w), ROLN_E_NOT_FINITE); /* overflow */
    X[0] = X[3] = ROLN_EPS < ROLN_C(1e-10) ? (roln_real)1e153 : (roln_real)1e18; /* e^35 is finite, A e^35 A^T is not */
    for (i = 0; i < 4; i++) X[4 + i] = 35 * X[0] * X[i];
    REFUSED(roln_spd_map(2, ROLN_EXP, 0, X, X + 4, Y, w), ROLN_E_NOT_FINITE);
    REFUSED(roln_spd_map(2, ROLN_POWER, bad[0], NULL, unit, Y, w), ROLN_E_NOT_FINITE);
}

/* Values, one by one: the limit of NOT_SPD, order of checks, f untouched. */
static void check_values(void)
{
    roln_real l[2], f[2];
    l[1] = 1, l[0] = 2 * ROLN_EPS, f[0] = f[1] = 7;
    CHECK(roln_map_values(2, ROLN_LOG, 0, l, f) == ROLN_E_NOT_SPD && f[0] == 7 && f[1] == 7);
    l[0] *= ROLN_C(1.001);
    CHECK(roln_map_values(2, ROLN_LOG, 0, l, f) == ROLN_OK && f[1] == 0);
    f[0] = f[1] = 7, l[0] = 1 / huge, l[1] = l[0] * 2;
    CHECK(roln_map_values(2, ROLN_POWER, -2, l, f) == ROLN_E_NOT_FINITE && f[0] == 7 && f[1] == 7);
    l[1] = (roln_real)INFINITY;
    CHECK(roln_map_values(2, ROLN_LOG, 0, l, f) == ROLN_E_NOT_FINITE && f[0] == 7);
    CHECK(roln_map_values(2, ROLN_EXP, 0, l, f) == ROLN_E_NOT_FINITE && f[0] == 7);
    l[0] = 0, l[1] = 41;
    CHECK(roln_map_values(2, ROLN_EXP, 0, l, f) == ROLN_E_RANGE && f[0] == 7);
}

/* Near both ends of the exponents nothing is lost. */
static void check_scales(void)
{
    roln_real X[8], d, w[STATUS_WORK];
    int i, k;
    for (i = 0; i < 2; i++) {
        const roln_real c = i ? huge * 64 : 1 / huge / 64;
        const roln_real B[4] = {2 * c, c, c, 3 * c};
        roln_real A[4];
        CHECK(roln_spd_map(2, ROLN_POWER, ROLN_C(0.5), NULL, B, X, w) == ROLN_OK);
        roln_mm(2, 2, 2, X, X, X + 4);
        for (k = 0; k < 4; k++) CHECK_NEAR(X[4 + k] / c, B[k] / c, 16 * EPS);
        CHECK(roln_chol(2, B, A) == ROLN_OK);
        for (k = 0; k < 4; k++) X[k] = B[k], X[4 + k] = 2 * B[k];
        CHECK(roln_spd_dist(2, A, X + 4, &d, w) == ROLN_OK);
        CHECK_NEAR(d, sqrtl(2) * logl(2), 16 * EPS);
    }
}

static void test_status(void)
{
    check_not_spd();
    check_not_finite();
    check_values();
    check_scales();
}

#ifdef ROLN_DOUBLE
/* ---- the library against itself: central differences of its own values, halving the step quarters the error ---- */

typedef struct {
    int n, map;
    double p, P[SNN], X[SNN], U[SNN], G[SNN];
} own_case;

static double own_value(void *ctx)
{
    own_case *c = (own_case *)ctx;
    double P[SNN], X[SNN], Y[SNN], w[ROLN_SPD_MAP_WORK(SN)];
    const int n = c->n, nn = n * n;
    int i;
    for (i = 0; i < nn; i++) {
        P[i] = (c->P[i] + c->P[i % n * n + i / n]) / 2;
        X[i] = (c->X[i] + c->X[i % n * n + i / n]) / 2;
    }
    CHECK(roln_chol(n, P, P) == ROLN_OK);
    CHECK(roln_spd_map(n, c->map, c->p, P, X, Y, w) == ROLN_OK);
    return roln_dot(nn, Y, c->G);
}

/* The second derivative of exp by differences of the first along F = G, at E = U. */
static void check_slope_d2(const own_case *c)
{
    enum { n = 3, nn = n * n };
    double V[nn], K[nn], l[n], T[n * nn], D[nn], t[nn], a[nn], b[nn], err[2], w[ROLN_SPD_FRAME_WORK(n) + ROLN_SPD_MAP_D_WORK(n)];
    int m, i, q;
    CHECK(roln_spd_frame(n, NULL, c->U, l, V, V, w) == ROLN_OK);
    roln_exp_dd1(n, l, K);
    roln_exp_dd2(n, l, K, T);
    exp_d2(n, T, V, V, c->P, c->G, D);
    for (q = 0; q < 2; q++) {
        const double h = q ? 5e-3 : 1e-2;
        err[q] = 0;
        for (m = 0; m < 2; m++) {
            for (i = 0; i < nn; i++) t[i] = c->U[i] + (m ? -h : h) * c->G[i];
            CHECK(roln_spd_frame(n, NULL, t, l, V, V, w) == ROLN_OK);
            roln_exp_dd1(n, l, K);
            roln_spd_map_d(n, K, V, V, c->P, m ? b : a, w);
        }
        for (i = 0; i < nn; i++) err[q] += fabs((a[i] - b[i]) / (2 * h) - D[i]);
    }
    CHECK_NEAR(err[0] / err[1], 4, 0.02);
}

static void test_slopes(uint64_t *s)
{
    enum { n = 3, nn = n * n };
    static own_case c;
    double A[nn], V[nn], W[nn], K[nn], l[n], f[n], g1[nn], g2[nn], w[ROLN_SPD_FRAME_WORK(n) + ROLN_SPD_MAP_BWD_WORK(n)];
    int m;
    c.n = n;
    random_spd(n, 0, s, c.X);
    random_spd(n, 0, s, c.P), random_sym(n, 1, s, c.U), random_sym(n, 1, s, c.G);
    CHECK(roln_chol(n, c.P, A) == ROLN_OK);
    CHECK(roln_spd_frame(n, A, c.X, l, V, W, w) == ROLN_OK);
    for (m = 0; m < MAPS; m++) {
        c.map = maps[m].map, c.p = maps[m].p;
        CHECK(roln_map_values(n, c.map, c.p, l, f) == ROLN_OK);
        roln_map_dd1(n, c.map, c.p, l, f, K);
        memset(g1, 0, sizeof g1), memset(g2, 0, sizeof g2);
        roln_spd_map_bwd(n, l, f, K, V, W, c.G, g1, g2, w);
        check_halving(nn, g1, c.X, 4e-3, own_value, &c);
        check_halving(nn, g2, c.P, 4e-3, own_value, &c);
    }
    check_slope_d2(&c);
}
#endif

void TEST_NAME(spd)(void)
{
    uint64_t seed = 11, own = 12;
    int n, m, kind, rep;
    test_differences();
    for (n = 1; n <= 4; n++)
        for (m = 0; m < MAPS; m++)
            for (kind = 0; kind < KINDS; kind++) {
                check_map(n, 0, m, kind, &seed);
                check_map(n, 1, m, kind, &seed);
            }
    for (m = 0; m < MAPS; m++) check_map(SN, 1, m, 3, &seed);
    for (n = 1; n <= SN; n++)
        for (rep = 0; rep < 4; rep++) {
            check_exp_d2(n, 0, rep == 3 ? 0 : rep * 0.6L, &seed); /* scale 0: all eigenvalues equal */
            check_exp_d2(n, 1, rep == 3 ? 0 : rep * 0.6L, &seed);
        }
    for (n = 2; n <= 16; n += n < 6 ? 1 : 5)
        for (m = 0; m < MAPS; m++)
            for (kind = 0; kind < 3; kind++)
                for (rep = 1; rep <= 40; rep++) check_accuracy(n, maps[m].map, maps[m].p, rep / 40., kind, &own);
    for (n = 1; n <= SN; n++)
        for (rep = 0; rep < 20; rep++) check_distances(n, &seed);
    for (kind = 0; kind < KINDS; kind++) {
        for (n = 1; n <= SN; n++) check_map_identities(n, kind, &seed);
        for (n = 1; n <= 4; n++) {
            check_dist(n, 0, kind, &seed);
            check_dist(n, 1, kind, &seed);
        }
    }
    for (n = 1; n <= SN; n++)
        for (rep = 1; rep <= 3; rep++) check_rooms(n, &seed);
    test_status();
#ifdef ROLN_DOUBLE
    test_slopes(&seed);
#endif
    print_bounds();
}
