/* SPDX-License-Identifier: MIT */
/* Eigensolver and divided differences of exp (roln_spd.h, sections 6 and 7) against slow independent twins in long double:
   cyclic Jacobi, quotients and series. */
#include "eig.h"

void TEST_NAME(eig)(void);

/* ---- eigensolver ---- */

/* Every family, every n to 32, some repeated, and a few above: bounds of residual, orthogonality and eigenvalues. */
static void test_families(void)
{
    uint64_t seed = 1;
    int f, n, rep;
    for (f = 0; f < FAMILIES; f++)
        for (n = 1; n <= 32; n++)
            for (rep = 0; rep < (n > 8 ? 1 : f < SPLIT ? 20 : 1000); rep++) {
                eig_errors e;
                family(f, n, &seed);
                CHECK(roln_eig(n, A, l, Q, work) == ROLN_OK);
                e = eig_check(n);
                BOUND("eig: residual, n eps max|A|", e.residual, EIG_RESIDUAL);
                BOUND("eig: orthogonality, n eps", e.orthogonal, EIG_ORTHOGONAL);
                BOUND("eig: eigenvalues, n eps max|A|", e.value, 4);
            }
    for (f = 0; f < FAMILIES; f++)
        for (n = 40; n <= (f % 5 ? 128 : EIG_MAX); n += n < 64 ? 24 : n < 128 ? 64 : 512) {
            eig_errors e;
            family(f, n, &seed);
            CHECK(roln_eig(n, A, l, Q, work) == ROLN_OK);
            e = eig_residual(n);
            BOUND("eig: residual, n eps max|A|", e.residual, EIG_RESIDUAL);
            BOUND("eig: orthogonality, n eps", e.orthogonal, EIG_ORTHOGONAL);
        }
}

/* The worst that a search for orthogonality and for the residual has found as float: beyond 4 and 8, which were once promised. */
static void test_found(void)
{
    static const double found[2][6] = {{-7.01927423, -582.879272, 2909.4104, -91.5998306, -755.367615, -5911.43164},
                                       {-0.351762414, 0.95171386, -18.3428936, -2.56882238, -16.148735, -9.24960804}};
    int f, i, j, k;
    for (f = 0; f < 2; f++) {
        eig_errors e;
        for (k = 0, i = 0; i < 3; i++)
            for (j = 0; j <= i; j++)
                A[i * 3 + j] = A[j * 3 + i] = (roln_real)found[f][k++];
        CHECK(roln_eig(3, A, l, Q, work) == ROLN_OK);
        e = eig_check(3);
        BOUND("eig: residual, n eps max|A|", e.residual, EIG_RESIDUAL);
        BOUND("eig: orthogonality, n eps", e.orthogonal, EIG_ORTHOGONAL);
        if (ROLN_EPS > ROLN_C(1e-10)) CHECK(e.orthogonal > 4 || e.residual > 8);
    }
}

/* A sweep that splits off a block with c = -1: two eigenvectors were once exchanged. */
static void test_split(void)
{
    const roln_real tiny = ROLN_EPS < ROLN_C(1e-10) ? (roln_real)1e-41 : (roln_real)1e-24;
    const roln_real S[16] = {0, ROLN_C(1e-3), 0, 0, ROLN_C(1e-3), 0, tiny, 0, 0, tiny, 0, ROLN_C(0.1), 0, 0, ROLN_C(0.1), 0};
    roln_real Y[16], w[ROLN_SPD_MAP_WORK(4)];
    ld a[16], y[16];
    eig_errors e;
    memcpy(A, S, sizeof S);
    CHECK(roln_eig(4, A, l, Q, work) == ROLN_OK);
    e = eig_check(4);
    CHECK_BELOW(e.residual, EIG_RESIDUAL);
    CHECK_BELOW(e.orthogonal, EIG_ORTHOGONAL);
    CHECK_BELOW(e.value, 4);
    CHECK(roln_spd_map(4, ROLN_EXP, 0, NULL, S, Y, w) == ROLN_OK);
    widen(16, S, a);
    t_exp(4, a, y);
    CHECK_BELOW(distance(16, Y, y), 8 * EPS);
    CHECK_NEAR(Y[1], sinhl((ld)S[1]), 8 * EPS);
}

static void test_edges(void)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    roln_real Q2[25], l2[5];
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

/* Half of the sweeps that it may take are enough; with too few it says so, and what calls it leaves its outputs alone. */
static void test_sweeps(void)
{
    roln_real Y[64], w[ROLN_SPD_MAP_WORK(8)];
    uint64_t seed = 9;
    int most[9] = {0}, n, k, i;
    for (n = 2; n <= 8; n++)
        for (k = 0; k < 4000; k++) {
            family(k % FAMILIES, n, &seed);
            CHECK(eig_counted(n, &most[n]) == ROLN_OK);
        }
    CHECK(most[2] == 1); /* one rotation */
    for (n = 3; n <= 8; n++) {
        CHECK(most[n] >= n && most[n] <= ROLNI_EIG_MOST(n) / 2);
        family(0, n, &seed);
        for (i = 0; i < n * n; i++) Y[i] = 7;
        eig_cap = 1;
        CHECK(roln_eig(n, A, l, Q, work) == ROLN_E_NO_CONVERGENCE);
        CHECK(roln_spd_map(n, ROLN_EXP, 0, NULL, A, Y, w) == ROLN_E_NO_CONVERGENCE);
        eig_cap = 0;
        for (i = 0; i < n * n; i++) CHECK(Y[i] == 7);
        CHECK(roln_eig(n, A, l, Q, work) == ROLN_OK);
    }
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
    test_split();
    test_found();
    test_edges();
    test_sweeps();
    test_differences();
    test_range();
    print_bounds();
}
