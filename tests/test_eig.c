/* Eigensolver and SPD maps (roln_spd.h, sections 6 and 7) against slow independent twins in long double:
   cyclic Jacobi for eigenvalues and square roots, scaling and squaring of the Taylor series for exp, block
   triangular exponentials for its derivatives (Mathias 1996), central differences for the backward in P. */
#include "../roln_spd.h"
#include "twin.h"

void TEST_NAME(eig)(void);

#define MAXN 640

static roln_real A[MAXN * MAXN], Q[MAXN * MAXN], Q2[MAXN * MAXN], l[MAXN], l2[MAXN], work[ROLN_EIG_WORK(MAXN)];

/* ---- twins ---- */

/* s = P^pw by Jacobi */
static void t_power(int n, const ld *P, ld pw, ld *s)
{
    static ld a[TN * TN], v[TN * TN];
    int i, j, k;
    memcpy(a, P, (size_t)(n * n) * sizeof *a);
    t_jacobi(n, a, v);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            s[i * n + j] = 0;
            for (k = 0; k < n; k++) s[i * n + j] += v[i * n + k] * powl(a[k * n + k], pw) * v[j * n + k];
        }
}

/* exp_P(U) with the symmetric square root */
static void t_exp_at(int n, const ld *P, const ld *U, ld *X)
{
    static ld s[TN * TN], r[TN * TN], t[TN * TN];
    t_power(n, P, 0.5L, s);
    t_power(n, P, -0.5L, r);
    t_mul(n, r, U, t);
    t_mul(n, t, r, t);
    t_exp(n, t, X);
    t_mul(n, s, X, t);
    t_mul(n, t, s, X);
}

static ld t_dot(int n, const ld *a, const ld *b)
{
    ld s = 0;
    int i;
    for (i = 0; i < n; i++) s += a[i] * b[i];
    return s;
}

/* largest |a - b| over largest |b| */
static ld relative(int n, const roln_real *a, const ld *b)
{
    ld d = 0, m = 0;
    int i;
    for (i = 0; i < n; i++) {
        if (!roln_finite(a[i])) return 1e30L;
        if (fabsl((ld)a[i] - b[i]) > d) d = fabsl((ld)a[i] - b[i]);
        if (fabsl(b[i]) > m) m = fabsl(b[i]);
    }
    return d / m;
}

static ld t_top(int n, const roln_real *a)
{
    ld m = 0;
    while (n--)
        if (fabsl((ld)a[n]) > m) m = fabsl((ld)a[n]);
    return m;
}

static void random_sym(int n, ld scale, uint64_t *s, roln_real *a)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) a[i * n + j] = a[j * n + i] = (roln_real)(scale * (ld)roln_normal(s));
}

/* ---- eigensolver ---- */

#ifdef ROLN_DOUBLE
#define BIG 1e306L
#define SMALL 1e-318L
#define TINIEST 4.95e-324L
#else
#define BIG 2e36L
#define SMALL 1e-42L
#define TINIEST 1.41e-45L
#endif
#define FAMILIES 25

static void family(int f, int n, uint64_t *s)
{
    static ld v[MAXN];
    ld vv = 0;
    int i, j;
    for (i = 0; i < n; i++) v[i] = (ld)roln_normal(s), vv += v[i] * v[i];
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            ld x = (ld)roln_normal(s), gi = powl(10, -20.0L * (ld)i / (ld)n), gj = powl(10, -20.0L * (ld)j / (ld)n), eq = i == j;
            switch (f) {
            case 0: break;                                                  /* random */
            case 1: x *= BIG; break;                                        /* near overflow */
            case 2: x *= SMALL; break;                                      /* denormal */
            case 3: x *= 1e-18L; break;
            case 4: x *= 1e18L; break;
            case 5: x *= sqrtl(gi * gj); break;                             /* graded over 20 decades, down */
            case 6: x *= 1e-20L / sqrtl(gi * gj); break;                    /* and up */
            case 7: x *= gi * gj; break;                                    /* over 40 */
            case 8: x = eq + 10 * EPS * x; break;                           /* clustered at 1 */
            case 9: x = (i < n / 2 ? eq : -eq) + EPS * x; break;            /* two clusters */
            case 10: x = eq - 2 * v[i] * v[j] / vv; break;                  /* reflection: repeated */
            case 11: x = v[i] * v[j]; break;                                /* rank one */
            case 12: x = (1 + i % 3) * (1 + j % 3); break;                  /* rank one, integers */
            case 13: x = eq * v[i]; break;                                  /* diagonal */
            case 14: x = eq * (i % 4) + 0.1L * EPS * x; break;              /* diagonal up to rounding, repeated */
            case 15: x = 0; break;
            case 16: x = eq; break;
            case 17: x = i == j ? fabsl((ld)i - 0.5L * (ld)(n - 1)) : i == j + 1; break; /* Wilkinson */
            case 18: x = i == j ? i : j == 0; break;                        /* arrow */
            case 19: x = i == j ? i : i == n - 1; break;                    /* arrow, other way */
            case 20: x = i == j + 1; break;                                 /* zero diagonal */
            case 21: x = i == j + 1 ? 1e-12L : (i == n - 1 && eq != 0); break;
            case 22: x = 1.0L / (i + j + 1); break;                         /* Hilbert */
            case 23: x = 2 * eq - (i == j + 1); break;                      /* Laplacian */
            case 24: x = i % 2 == j % 2 ? 0 : x; break;                     /* bipartite: +- pairs */
            }
            A[i * n + j] = A[j * n + i] = (roln_real)x;
        }
}

/* Residual and orthogonality in units of n eps max|A| and n eps, rows of Q stepped for large n. */
static void residual(int n, ld *res, ld *orth)
{
    const int step = n > 128 ? 23 : 1;
    ld top = TINIEST, r = 0, o = 0;
    int i, j, k;
    for (i = 0; i < n * n; i++)
        if (fabsl((ld)A[i]) > top) top = fabsl((ld)A[i]);
    for (i = 0; i < n; i += step)
        for (j = 0; j < n; j++) {
            ld x = (ld)A[i * n + j], y = i == j;
            for (k = 0; k < n; k++) {
                x -= (ld)Q[k * n + i] * (ld)l[k] * (ld)Q[k * n + j];
                y -= (ld)Q[i * n + k] * (ld)Q[j * n + k];
            }
            x = fabsl(x) - (ld)n * TINIEST;
            if (!(x <= r)) r = x;
            if (!(fabsl(y) <= o)) o = fabsl(y);
        }
    *res = r / (top * (ld)n * EPS);
    *orth = o / ((ld)n * EPS);
}

static void test_families(void)
{
    static ld B[TN * TN], V[TN * TN];
    ld worst_r = 0, worst_o = 0, worst_l = 0;
    uint64_t seed = 1;
    int f, n, i, j, rep;
    for (f = 0; f < FAMILIES; f++)
        for (n = 1; n <= 128; n += n < 40 ? 1 : n < 64 ? 24 : 64)
            for (rep = 0; rep < (n <= 6 ? 20 : 1); rep++) {
                ld r, o, d = 0, top = TINIEST;
                int sorted = 1;
                family(f, n, &seed);
                CHECK(roln_eig(n, A, l, Q, work) == ROLN_OK);
                residual(n, &r, &o);
                CHECK_BELOW(r, 8);
                CHECK_BELOW(o, 4);
                for (i = 1; i < n; i++) sorted &= l[i - 1] <= l[i];
                CHECK(sorted);
                if (r > worst_r) worst_r = r;
                if (o > worst_o) worst_o = o;
                if (n > 20) continue;
                for (i = 0; i < n * n; i++) { /* eigenvalues against Jacobi */
                    B[i] = (ld)A[i];
                    if (fabsl(B[i]) > top) top = fabsl(B[i]);
                }
                t_jacobi(n, B, V);
                for (i = 0; i < n; i++) {
                    ld x;
                    for (j = i + 1; j < n; j++)
                        if (B[j * n + j] < B[i * n + i]) x = B[i * n + i], B[i * n + i] = B[j * n + j], B[j * n + j] = x;
                    x = (fabsl(B[i * n + i] - (ld)l[i]) - TINIEST) / (top * (ld)n * EPS);
                    if (!(x <= d)) d = x;
                }
                CHECK_BELOW(d, 4);
                if (d > worst_l) worst_l = d;
            }
    for (f = 0; f < 12; f += 5) { /* random, graded, reflection */
        ld r, o;
        family(f, MAXN, &seed);
        CHECK(roln_eig(MAXN, A, l, Q, work) == ROLN_OK);
        residual(MAXN, &r, &o);
        CHECK_BELOW(r, 8);
        CHECK_BELOW(o, 4);
    }
#ifdef ROLN_TEST_VERBOSE
    printf("eig " TEST_PRECISION ": residual %.2Lf, orthogonality %.2Lf, eigenvalue %.2Lf (units of n eps)\n", worst_r, worst_o, worst_l);
#endif
    (void)worst_l;
}

static void test_edges(void)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    uint64_t seed = 5;
    int n, p, b, i;
    for (n = 1; n <= 5; n++) {
        for (p = 0; p < n * n; p++)
            for (b = 0; b < 3; b++) {
                family(0, n, &seed);
                A[p] = A[p % n * n + p / n] = bad[b];
                for (i = 0; i < n * n; i++) Q[i] = 7, l[i % n] = 7;
                CHECK(roln_eig(n, A, l, Q, work) == ROLN_E_NOT_FINITE);
                for (i = 0; i < n * n; i++) CHECK(Q[i] == 7 && l[i % n] == 7);
            }
        family(0, n, &seed); /* in place */
        CHECK(roln_eig(n, A, l, Q, work) == ROLN_OK);
        memcpy(Q2, A, sizeof *A * (size_t)(n * n));
        CHECK(roln_eig(n, Q2, l2, Q2, work) == ROLN_OK);
        CHECK(memcmp(Q, Q2, sizeof *Q * (size_t)(n * n)) == 0 && memcmp(l, l2, sizeof *l * (size_t)n) == 0);
        for (i = 0; i < n * n; i++) A[i] *= (roln_real)ldexp(1, -70); /* the unit does not matter, to the bit */
        CHECK(roln_eig(n, A, l2, Q2, work) == ROLN_OK);
        CHECK(memcmp(Q, Q2, sizeof *Q * (size_t)(n * n)) == 0);
        for (i = 0; i < n; i++) CHECK(l2[i] == l[i] * (roln_real)ldexp(1, -70));
    }
    for (i = 0; i < 4; i++) A[i] = (roln_real)(BIG * 170); /* twice the largest entry overflows */
    for (; A[0] * 2 <= A[0] * 2 && roln_finite(A[0] * 2);) A[0] = A[1] = A[2] = A[3] = A[0] * 2;
    CHECK(roln_eig(2, A, l, Q, work) == ROLN_E_NOT_FINITE);
}

/* ---- SPD maps ---- */

/* exp[a,b,c] by its own route: quotient in long double, or the series about the mean of the three */
static ld t_dd1(ld a, ld b)
{
    ld x = (a - b) / 2;
    return expl((a + b) / 2) * (fabsl(x) < 1e-6L ? 1 + x * x / 6 : sinhl(x) / x);
}

static ld t_dd2(ld a, ld b, ld c)
{
    ld m = (a + b + c) / 3, e2, e3, h[3] = {1, 0, 0}, sum = 0.5L, f = 2, x;
    int k;
    if (c - a >= 0.5L) return (t_dd1(b, c) - t_dd1(a, b)) / (c - a);
    a -= m, b -= m, c -= m;
    e2 = a * b + a * c + b * c, e3 = a * b * c;
    for (k = 1; k < 30; k++) { /* h[0] = h_k-1, h[1] = h_k-2, h[2] = h_k-3 */
        x = k == 1 ? 0 : -e2 * h[1] + e3 * h[2];
        h[2] = h[1], h[1] = h[0], h[0] = x;
        sum += x / (f *= (ld)(k + 2));
    }
    return expl(m) * sum;
}

static void test_differences(void)
{
    static const double gap[] = {0, 1e-9, 1e-7, 1e-5, 1e-3, 0.1, 0.3, 0.5, 0.7, 0.99, 1.0, 1.01, 1.5, 3, 6, 13, 20};
    const int gaps = (int)(sizeof gap / sizeof *gap);
    roln_real x[3], K[9], T[27];
    ld worst1 = 0, worst2[2] = {0, 0}; /* series, quotient */
    int g, h, c, i, j, k;
    for (c = -19; c <= 19; c++)
        for (g = 0; g < gaps; g++)
            for (h = 0; h < gaps; h++) {
                x[0] = (roln_real)(c * 1.03 - 0.5 * (gap[g] + gap[h]));
                x[1] = x[0] + (roln_real)gap[g];
                x[2] = x[1] + (roln_real)gap[h];
                roln_exp_dd1(3, x, K);
                roln_exp_dd2(3, x, K, T);
                for (i = 0; i < 3; i++)
                    for (j = 0; j < 3; j++) {
                        ld r = t_dd1((ld)x[i], (ld)x[j]), d = fabsl((ld)K[i * 3 + j] / r - 1) / EPS;
                        if (!(d <= worst1)) worst1 = d;
                        for (k = 0; k < 3; k++) {
                            int lo = i < j ? i : j, hi = i < j ? j : i, mid;
                            if (k < lo) mid = lo, lo = k;
                            else if (k > hi) mid = hi, hi = k;
                            else mid = k;
                            r = t_dd2((ld)x[lo], (ld)x[mid], (ld)x[hi]);
                            d = fabsl((ld)T[i * 9 + j * 3 + k] / r - 1) / EPS;
                            if (!(d <= worst2[x[hi] - x[lo] >= 1])) worst2[x[hi] - x[lo] >= 1] = d;
                        }
                    }
            }
    CHECK_BELOW(worst1, 3);
    CHECK_BELOW(worst2[0], 2);
    CHECK_BELOW(worst2[1], 6);
#ifdef ROLN_TEST_VERBOSE
    printf("dd " TEST_PRECISION ": first %.2Lf eps, second %.2Lf (series) %.2Lf (quotient) eps\n", worst1, worst2[0], worst2[1]);
#endif
}

static void test_range(void)
{
#ifdef ROLN_DOUBLE
    const roln_real span = 32;
#else
    const roln_real span = 14;
#endif
    roln_real x[3] = {-1, 0, 1}, U[4] = {50, 0, 0, 50}, X[4] = {7, 7, 7, 7}, w[ROLN_SPD_EXP_WORK(2)];
    CHECK(roln_exp_range(3, x) == ROLN_OK);
    x[0] = -2, x[2] = span - 2;
    CHECK(roln_exp_range(3, x) == ROLN_OK);
    x[2] += ROLN_C(0.001);
    CHECK(roln_exp_range(3, x) == ROLN_E_RANGE);
    x[0] = 38, x[1] = 39, x[2] = 40;
    CHECK(roln_exp_range(3, x) == ROLN_OK);
    x[2] = ROLN_C(40.001);
    CHECK(roln_exp_range(3, x) == ROLN_E_RANGE);
    x[0] = ROLN_C(-40.001), x[1] = x[2] = -39;
    CHECK(roln_exp_range(3, x) == ROLN_E_RANGE);
    x[1] = (roln_real)NAN;
    CHECK(roln_exp_range(3, x) == ROLN_E_NOT_FINITE);
    CHECK(roln_spd_exp(2, NULL, U, X, w) == ROLN_E_RANGE);
    U[1] = U[2] = (roln_real)INFINITY;
    CHECK(roln_spd_exp(2, NULL, U, X, w) == ROLN_E_NOT_FINITE);
    CHECK(X[0] == 7 && X[1] == 7 && X[2] == 7 && X[3] == 7);
}

#define SN 9 /* largest n of the tests below; the twins take 4 n */

/* The whole of section 7 at one U and, if based, one P: values, derivatives, backward. */
static void check_maps(int n, int based, ld scale, uint64_t *s)
{
    static roln_real U[SN * SN], P[SN * SN], L[SN * SN], X[SN * SN], Xi[SN * SN], E[SN * SN], F[SN * SN], G[SN * SN], D[SN * SN];
    static roln_real V[SN * SN], W[SN * SN], K[SN * SN], T[SN * SN * SN], gU[SN * SN], gP[SN * SN], w[ROLN_SPD_EXP_WORK(SN)], ev[SN], y[SN], z[SN];
    static ld u[SN * SN], p[SN * SN], r[SN * SN], ri[SN * SN], e[SN * SN], f[SN * SN], g[SN * SN], x[SN * SN], pp[SN * SN], B[TN * TN], t[TN * TN];
    const roln_real *VV = V, *WW = V;
    const ld tol = EPS * (ld)n;
    ld fd[2], err, tr;
    int i, j, k, q, N;

    random_sym(n, scale, s, U);
    random_sym(n, 1, s, E);
    random_sym(n, 1, s, F);
    random_sym(n, 1, s, G);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            P[i * n + j] = based ? (roln_real)(i == j) : 0;
            for (k = 0; k < n && based; k++) P[i * n + j] += ROLN_C(0.2) * E[i * n + k] * E[j * n + k];
        }
    if (!based)
        for (i = 0; i < n; i++) P[i * n + i] = 1;
    random_sym(n, 1, s, E);
    widen(n * n, U, u), widen(n * n, P, p), widen(n * n, E, e), widen(n * n, F, f), widen(n * n, G, g);

    /* frame and values */
    if (based) {
        CHECK(roln_chol(n, P, L) == ROLN_OK);
        CHECK(roln_spd_frame(n, L, U, ev, V, W, w) == ROLN_OK);
        WW = W;
        CHECK(roln_spd_exp(n, L, U, X, w) == ROLN_OK);
    } else {
        CHECK(roln_eig(n, U, ev, V, w) == ROLN_OK);
        CHECK(roln_spd_exp(n, NULL, U, X, w) == ROLN_OK);
    }
    t_exp_at(n, p, u, r);
    CHECK_BELOW(relative(n * n, X, r), 12 * tol);
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++) CHECK(X[i * n + j] == X[j * n + i]);
    roln_spd_form(n, 1, ev, VV, Xi, w);
    CHECK(memcmp(X, Xi, sizeof *X * (size_t)(n * n)) == 0);
    for (i = 0; i < n * n; i++) t[i] = -u[i]; /* exp_P(U)^-1 = P^-1 exp_P(-U) P^-1 */
    t_exp_at(n, p, t, x);
    t_power(n, p, -1, t);
    t_mul(n, t, x, ri);
    t_mul(n, ri, t, ri);
    roln_spd_form(n, -1, ev, WW, Xi, w);
    CHECK_BELOW(relative(n * n, Xi, ri), 12 * tol);
    for (i = 0; i < n; i++) z[i] = E[i];
    for (q = 0; q < 2; q++) {
        roln_spd_mul(n, q ? -1 : 1, ev, q ? WW : VV, z, y);
        for (i = 0; i < n; i++)
            for (t[i] = 0, k = 0; k < n; k++) t[i] += (q ? ri : r)[i * n + k] * e[k];
        CHECK_BELOW(relative(n, y, t), 20 * tol);
    }

    /* first derivative: exp [U E; 0 U] = [., D; 0 .], at a base point between two square roots */
    roln_exp_dd1(n, ev, K);
    roln_exp_dd2(n, ev, K, T);
    t_power(n, p, -0.5L, pp);
    t_power(n, p, 0.5L, x);
#define INTO(a, c) t_mul(n, pp, a, c), t_mul(n, c, pp, c)
    INTO(u, ri);
    INTO(e, r);
    N = 2 * n;
    for (i = 0; i < N * N; i++) B[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            B[i * N + j] = B[(i + n) * N + j + n] = ri[i * n + j];
            B[i * N + j + n] = r[i * n + j];
        }
    t_exp(N, B, t);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) B[i * n + j] = t[i * N + j + n];
    t_mul(n, x, B, r);
    t_mul(n, r, x, r);
    roln_spd_exp_d(n, K, VV, WW, E, D, w);
    CHECK_BELOW(relative(n * n, D, r), 16 * tol);
    tr = t_dot(n * n, g, r);

    /* backward: <g_U, E> = <G, D[E]>; <g_P, F> against Richardson differences of the twin; both add */
    for (i = 0; i < n * n; i++) gU[i] = gP[i] = 1;
    roln_spd_exp_bwd(n, ev, K, VV, WW, G, gU, gP, w);
    for (err = 0, i = 0; i < n * n; i++) err += ((ld)gU[i] - 1) * e[i];
    {
        ld size = 0;
        for (i = 0; i < n * n; i++) size += fabsl((ld)gU[i] * e[i]);
        CHECK_NEAR(err / size, tr / size, 12 * tol);
        for (q = 0; q < 2; q++) {
            const ld h = q ? 1e-4L : 2e-4L;
            for (i = 0; i < n * n; i++) t[i] = p[i] + h * f[i];
            t_exp_at(n, t, u, r);
            fd[q] = t_dot(n * n, g, r);
            for (i = 0; i < n * n; i++) t[i] = p[i] - h * f[i];
            t_exp_at(n, t, u, r);
            fd[q] = (fd[q] - t_dot(n * n, g, r)) / (2 * h);
        }
        for (err = size = 0, i = 0; i < n * n; i++) err += ((ld)gP[i] - 1) * f[i], size += fabsl((ld)gP[i] * f[i]);
        CHECK_NEAR(err / size, (4 * fd[1] - fd[0]) / 3 / size, 12 * tol + 1e-12L);
    }
    for (i = 0; i < n * n; i++) CHECK_NEAR(gP[i], gP[i % n * n + i / n], 8 * tol * t_top(n * n, gP));
    memcpy(X, gU, sizeof X);
    for (i = 0; i < n * n; i++) gU[i] = 1;
    roln_spd_exp_bwd(n, ev, K, VV, WW, G, gU, NULL, w);
    CHECK(memcmp(X, gU, sizeof *X * (size_t)(n * n)) == 0);

    /* second derivative: the corner of exp [U E F 0; . U 0 F; . . U E; . . . U] */
    INTO(e, r);
    INTO(f, g);
    N = 4 * n;
    for (i = 0; i < N * N; i++) B[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            for (k = 0; k < 4; k++) B[(i + k * n) * N + j + k * n] = ri[i * n + j];
            B[i * N + j + n] = B[(i + 2 * n) * N + j + 3 * n] = r[i * n + j];
            B[i * N + j + 2 * n] = B[(i + n) * N + j + 3 * n] = g[i * n + j];
        }
    t_exp(N, B, t);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) B[i * n + j] = t[i * N + j + 3 * n];
    t_mul(n, x, B, r);
    t_mul(n, r, x, r);
    roln_spd_exp_d2(n, T, VV, WW, E, F, D, w);
    CHECK_BELOW(relative(n * n, D, r), 24 * tol);

    /* eigenbasis: <G, D2[E,F]> = <F, D2[E,G]>; the increment adds and is symmetric to the bit */
    for (i = 0; i < n * n; i++) D[i] = X[i] = 0;
    roln_exp_d2(n, T, E, F, D);
    roln_exp_d2(n, T, E, G, X);
    for (fd[0] = fd[1] = err = 0, i = 0; i < n * n; i++) {
        fd[0] += (ld)G[i] * (ld)D[i], fd[1] += (ld)F[i] * (ld)X[i];
        err += fabsl((ld)G[i] * (ld)D[i]);
        CHECK(D[i] == D[i % n * n + i / n]);
    }
    CHECK_NEAR(fd[0] / err, fd[1] / err, 4 * tol);
    memcpy(X, D, sizeof X);
    roln_exp_d2(n, T, E, F, D);
    for (i = 0; i < n * n; i++) CHECK_NEAR(D[i], 2 * X[i], 4 * EPS * (ld)ROLN_ABS(X[i]) + tol * err / (ld)(n * n));
}

#ifdef ROLN_DOUBLE
/* Central differences of the library's own maps: halving h quarters the error. */
static void test_slopes(void)
{
    enum { n = 5 };
    double U[n * n], E[n * n], F[n * n], V[n * n], ev[n], K[n * n], T[n * n * n], D[n * n], D2[n * n];
    double t[n * n], a[n * n], b[n * n], w[ROLN_SPD_EXP_WORK(n)], err[2][2];
    uint64_t s = 99;
    int i, q;
    random_sym(n, 0.5L, &s, U);
    random_sym(n, 0.5L, &s, E);
    random_sym(n, 0.5L, &s, F);
    CHECK(roln_eig(n, U, ev, V, w) == ROLN_OK);
    roln_exp_dd1(n, ev, K);
    roln_exp_dd2(n, ev, K, T);
    roln_spd_exp_d(n, K, V, V, E, D, w);
    roln_spd_exp_d2(n, T, V, V, E, F, D2, w);
    for (q = 0; q < 2; q++) {
        const double h = q ? 5e-3 : 1e-2;
        err[0][q] = err[1][q] = 0;
        for (i = 0; i < n * n; i++) t[i] = U[i] + h * E[i];
        CHECK(roln_spd_exp(n, NULL, t, a, w) == ROLN_OK);
        for (i = 0; i < n * n; i++) t[i] = U[i] - h * E[i];
        CHECK(roln_spd_exp(n, NULL, t, b, w) == ROLN_OK);
        for (i = 0; i < n * n; i++) err[0][q] += fabs((a[i] - b[i]) / (2 * h) - D[i]);
        for (i = 0; i < n * n; i++) t[i] = U[i] + h * F[i];
        CHECK(roln_eig(n, t, ev, V, w) == ROLN_OK);
        roln_exp_dd1(n, ev, K);
        roln_spd_exp_d(n, K, V, V, E, a, w);
        for (i = 0; i < n * n; i++) t[i] = U[i] - h * F[i];
        CHECK(roln_eig(n, t, ev, V, w) == ROLN_OK);
        roln_exp_dd1(n, ev, K);
        roln_spd_exp_d(n, K, V, V, E, b, w);
        for (i = 0; i < n * n; i++) err[1][q] += fabs((a[i] - b[i]) / (2 * h) - D2[i]);
    }
    CHECK_NEAR(err[0][0] / err[0][1], 4, 0.02);
    CHECK_NEAR(err[1][0] / err[1][1], 4, 0.02);
}
#endif

void TEST_NAME(eig)(void)
{
    uint64_t seed = 11;
    int n, rep;
    test_families();
    test_edges();
    test_differences();
    test_range();
    for (n = 1; n <= SN; n++)
        for (rep = 0; rep < 4; rep++) {
            check_maps(n, 0, rep == 3 ? 0 : rep * 0.6L, &seed); /* scale 0: all eigenvalues equal */
            check_maps(n, 1, rep == 3 ? 0 : rep * 0.6L, &seed);
        }
#ifdef ROLN_DOUBLE
    test_slopes();
#endif
}
