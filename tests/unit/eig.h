/* SPDX-License-Identifier: MIT */
/* eig.h - symmetric matrices that are hard on an eigensolver, and what is asked of roln_eig on each; for test_eig.c (a sample)
   and eig_million.c. The twin, t_eigenvalues, is cyclic Jacobi in the next wider type. */
#ifndef EIG_H
#define EIG_H

/* Sweeps after which roln_eig gives up: eig_cap, or, while that is 0, what it always takes. */
static int eig_cap;
#define ROLNI_EIG_SWEEPS(n) (eig_cap ? eig_cap : ROLNI_EIG_MOST(n))
#include "roln_spd.h"
#include "twin.h"

enum { EIG_MAX = 640 }; /* largest n */
static roln_real A[EIG_MAX * EIG_MAX], Q[EIG_MAX * EIG_MAX], l[EIG_MAX], work[ROLN_EIG_WORK(EIG_MAX)];

/* Near the largest number, denormal, the smallest number; the decades between them. */
#ifdef ROLN_DOUBLE
#define BIG 1e306L
#define SMALL 1e-318L
#define TINIEST 4.95e-324L
#define DECADES 320
#else
#define BIG 2e36L
#define SMALL 1e-42L
#define TINIEST 1.41e-45L
#define DECADES 42
#endif

/* The documented bounds of the residual, in n eps max|A|, of orthogonality, in n eps, and of eigenvalues, in n eps max|A|. */
#define EIG_RESIDUAL 16
#define EIG_ORTHOGONAL 8
#define EIG_VALUE 8

static const char *const families[] = {
    "random", "near overflow", "denormal", "times 1e-18", "times 1e18", "graded down", "graded up", "graded, 40 decades",
    "clustered at 1", "two clusters", "reflection", "rank one", "rank one, integers", "diagonal", "diagonal, repeated", "zero",
    "identity", "Wilkinson", "arrow", "arrow, other way", "zero diagonal", "one far off", "Hilbert", "Laplacian", "bipartite",
    "couplings of any size", "the same, zero diagonal", "the same, reordered", "entries of any size", "rows of any size",
    "nearly split in two", "pairs, loosely coupled"};
enum { FAMILIES = sizeof families / sizeof *families, SPLIT = 25 }; /* from SPLIT on: over the whole exponent range */

/* 10^x; powl would take as long as all else in these tests */
ROLN_FN ld ten_to(ld x)
{
    return expl(2.30258509299404568402L * x);
}

/* 10^-x, x uniform in 0 .. decades, of either sign. */
ROLN_FN ld any_size(ld decades, uint64_t *s)
{
    const ld x = ten_to(-decades * (ld)roln_uniform(s));
    return roln_rand(s) >> 63 ? x : -x;
}

/* Entry (i, j), j <= i, of a matrix of one of the families before SPLIT; x a normal deviate, v of unit length. */
ROLN_FN ld family_entry(int f, int n, int i, int j, ld x, const ld *v)
{
    const ld gi = ten_to(-20.0L * (ld)i / (ld)n), gj = ten_to(-20.0L * (ld)j / (ld)n), eq = i == j;
    switch (f) {
    case 1: return x * BIG;
    case 2: return x * SMALL;
    case 3: return x * 1e-18L;
    case 4: return x * 1e18L;
    case 5: return x * sqrtl(gi * gj);
    case 6: return x * 1e-20L / sqrtl(gi * gj);
    case 7: return x * gi * gj;
    case 8: return eq + 10 * EPS * x;
    case 9: return (i < n / 2 ? eq : -eq) + EPS * x;
    case 10: return eq - 2 * v[i] * v[j];
    case 11: return v[i] * v[j];
    case 12: return (1 + i % 3) * (1 + j % 3);
    case 13: return eq * v[i];
    case 14: return eq * (i % 4) + 0.1L * EPS * x;
    case 15: return 0;
    case 16: return eq;
    case 17: return i == j ? fabsl((ld)i - 0.5L * (ld)(n - 1)) : i == j + 1;
    case 18: return i == j ? i : j == 0;
    case 19: return i == j ? i : i == n - 1;
    case 20: return i == j + 1;
    case 21: return i == j + 1 ? 1e-12L : (i == n - 1 && eq != 0);
    case 22: return 1.0L / (i + j + 1);
    case 23: return 2 * eq - (i == j + 1);
    case 24: return i % 2 == j % 2 ? 0 : x;
    default: return x;
    }
}

/* The same from SPLIT on; v[i]: a size for each row. Half of the diagonals, or all, are zero. */
ROLN_FN ld split_entry(int f, int n, int i, int j, ld x, const ld *v, uint64_t *s)
{
    const ld some = roln_rand(s) >> 63 ? x : 0;
    switch (f) {
    case 25: return i == j ? some : i == j + 1 ? any_size(DECADES, s) : 0;
    case 26:
    case 27: return i == j + 1 ? any_size(DECADES, s) : 0;
    case 28: return i == j ? some : any_size(DECADES, s);
    case 29: return x * v[i] * v[j];
    case 30: return (i < n / 2) == (j < n / 2) ? (i == j ? some : x) : x * v[0] * v[0];
    default: return i == j + 1 ? (i % 2 ? x : x * v[i] * v[j]) : 0;
    }
}

/* A <- a matrix of family f; from SPLIT on times a power of two from the whole exponent range. */
ROLN_FN void family(int f, int n, uint64_t *s)
{
    static ld v[EIG_MAX];
    const ld scale = f < SPLIT || roln_rand(s) >> 62 == 0 ? 1 : fabsl(any_size(DECADES, s)) * BIG;
    ld vv = 0;
    int i, j, k;
    for (i = 0; i < n; i++) v[i] = (ld)roln_normal(s), vv += v[i] * v[i];
    for (i = 0; i < n; i++) v[i] = f < SPLIT ? v[i] / sqrtl(vv) : fabsl(any_size(DECADES / 2, s));
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            const ld x = (ld)roln_normal(s);
            A[i * n + j] = A[j * n + i] = (roln_real)(f < SPLIT ? family_entry(f, n, i, j, x, v)
                                                                : scale * split_entry(f, n, i, j, x, v, s));
        }
    for (i = n - 1; i > 0 && f == 27; i--) { /* a random order of rows and columns */
        k = roln_randint(i + 1, s);
        for (j = 0; j < n; j++) t_swap(A + i * n + j, A + k * n + j);
        for (j = 0; j < n; j++) t_swap(A + j * n + i, A + j * n + k);
    }
}

/* roln_eig of A with at most *most sweeps, which is raised to as many as it takes. */
ROLN_FN roln_status eig_counted(int n, int *most)
{
    roln_status st = ROLN_E_NO_CONVERGENCE;
    for (eig_cap = ROLN_MAX(1, *most); eig_cap <= ROLNI_EIG_MOST(n) && st == ROLN_E_NO_CONVERGENCE; eig_cap++) {
        st = roln_eig(n, A, l, Q, work);
        *most = eig_cap;
    }
    eig_cap = 0;
    return st;
}

typedef struct { double residual, orthogonal, value; } eig_errors; /* worst, in the units of the bounds */

/* Largest entry of A, at least the smallest number: the unit of residuals and eigenvalues. */
ROLN_FN t_wide eig_unit(int n)
{
    t_wide top = (t_wide)TINIEST;
    int i;
    for (i = 0; i < n * n; i++)
        if (t_abs((t_wide)A[i]) > top) top = t_abs((t_wide)A[i]);
    return top;
}

/* Residual and orthogonality of l, Q; rows are stepped for large n. */
ROLN_FN eig_errors eig_residual(int n)
{
    const int step = n > 128 ? 23 : 1;
    t_wide r = 0, o = 0;
    eig_errors e = {0, 0, 0};
    int i, j, k;
    for (i = 0; i < n; i += step)
        for (j = 0; j < n; j++) {
            t_wide x = (t_wide)A[i * n + j], y = i == j;
            for (k = 0; k < n; k++) {
                x -= (t_wide)Q[k * n + i] * (t_wide)l[k] * (t_wide)Q[k * n + j];
                y -= (t_wide)Q[i * n + k] * (t_wide)Q[j * n + k];
            }
            x = t_abs(x) - (t_wide)n * (t_wide)TINIEST;
            if (!(x <= r)) r = x;
            if (!(t_abs(y) <= o)) o = t_abs(y);
        }
    e.residual = (double)(r / (eig_unit(n) * (t_wide)n * (t_wide)EPS));
    e.orthogonal = (double)(o / ((t_wide)n * (t_wide)EPS));
    return e;
}

/* All three, n <= TN. */
ROLN_FN eig_errors eig_check(int n)
{
    static t_wide twin[TN];
    const t_wide unit = eig_unit(n);
    eig_errors e = eig_residual(n);
    int i;
    t_eigenvalues(n, A, twin);
    for (i = 0; i < n; i++) {
        const double d = (double)((t_abs(twin[i] - (t_wide)l[i]) - (t_wide)TINIEST) / (unit * (t_wide)n * (t_wide)EPS));
        if (!(d <= e.value)) e.value = d;
        if (i > 0 && !(l[i - 1] <= l[i])) e.value = 1e30; /* not ascending */
    }
    return e;
}

#endif
