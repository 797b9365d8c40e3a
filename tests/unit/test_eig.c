/* Eigensolver and divided differences of exp (roln_spd.h, sections 6 and 7) against slow independent twins in long double:
   cyclic Jacobi, quotients and series. */
#include "roln_spd.h"
#include "twin.h"

void TEST_NAME(eig)(void);

#define MAXN 640

static roln_real A[MAXN * MAXN], Q[MAXN * MAXN], Q2[MAXN * MAXN], l[MAXN], l2[MAXN], work[ROLN_EIG_WORK(MAXN)];

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

/* ---- divided differences of exp ---- */

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
    roln_real x[3] = {-1, 0, 1};
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
}

void TEST_NAME(eig)(void)
{
    test_families();
    test_edges();
    test_differences();
    test_range();
}
