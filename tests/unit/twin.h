/* SPDX-License-Identifier: MIT */
/* twin.h - what the test files share: long double linear algebra, derivatives of a twin, guarded memory, and a table
   of worst errors against their bounds (printed with -DROLN_TEST_VERBOSE). Include after the header under test. */
#ifndef TWIN_H
#define TWIN_H

#include "check.h"

#ifdef __clang__ /* doubles meet long double twins on purpose; gcc only warns of float to double */
#pragma clang diagnostic ignored "-Wdouble-promotion"
#endif

typedef long double ld;
#define EPS ((ld)ROLN_EPS)

#ifdef ROLN_DOUBLE
#define PICK(f, d) (d)
#else
#define PICK(f, d) (f)
#endif

/* The next wider type, where long double is too slow. */
#ifdef ROLN_DOUBLE
typedef long double t_wide;
#define t_abs fabsl
#define t_sqrt sqrtl
#else
typedef double t_wide;
#define t_abs fabs
#define t_sqrt sqrt
#endif

/* ---- worst errors ---- */

static struct {
    const char *what;
    ld worst, bound;
} bounds[100];

/* value <= bound, both in the caller's unit; the worst value of each name is kept. */
ROLN_FN void check_bound(const char *what, ld value, ld bound, const char *file, int line)
{
    int i = 0;
    while (bounds[i].what && strcmp(bounds[i].what, what)) i++;
    bounds[i].what = what;
    bounds[i].bound = bound;
    if (!(value <= bounds[i].worst)) bounds[i].worst = value;
    check_below((double)value, (double)bound, what, file, line);
}
#define BOUND(what, value, bound) check_bound(what, value, bound, __FILE__, __LINE__)

ROLN_FN void print_bounds(void)
{
#ifdef ROLN_TEST_VERBOSE
    int i;
    for (i = 0; bounds[i].what; i++)
        printf("%-6s %-44s worst %8.3Lg  bound %8.3Lg\n", TEST_PRECISION, bounds[i].what, bounds[i].worst, bounds[i].bound);
#endif
}

/* ---- guarded memory ---- */

#define GUARD 16
static roln_real pool[1000000];
static int pool_at[128], pool_n[128], pools, pool_top;

ROLN_FN roln_real poison(void)
{
    roln_bits b = ROLNI_INF | (ROLNI_INF >> 1) | 0xdead; /* a NaN: reading before writing shows in the result */
    roln_real x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* n numbers of poison between guards, until fresh_done(). */
ROLN_FN roln_real *fresh(int n)
{
    const roln_real p = poison();
    const int room = pools < 128 && pool_top + n + 2 * GUARD <= (int)(sizeof pool / sizeof *pool);
    int i;
    CHECK(room);
    if (!room) pools = pool_top = 0;
    for (i = pool_top; i < pool_top + n + 2 * GUARD; i++) memcpy(pool + i, &p, sizeof p);
    pool_at[pools] = pool_top + GUARD;
    pool_n[pools] = n;
    pool_top += n + 2 * GUARD;
    return pool + pool_at[pools++];
}

ROLN_FN roln_real *zeros(int n)
{
    roln_real *x = fresh(n);
    memset(x, 0, (size_t)n * sizeof *x);
    return x;
}

ROLN_FN roln_real *copy(int n, const roln_real *x)
{
    roln_real *y = fresh(n);
    memcpy(y, x, (size_t)n * sizeof *y);
    return y;
}

/* n normal deviates, with all bits of the significand in use. */
ROLN_FN roln_real *normal(int n, double scale, uint64_t *seed)
{
    roln_real *x = fresh(n);
    int i;
    for (i = 0; i < n; i++) x[i] = (roln_real)(scale * 0.98765432109876543) * roln_normal(seed);
    return x;
}

ROLN_FN int same(int n, const roln_real *a, const roln_real *b)
{
    return memcmp(a, b, (size_t)n * sizeof *a) == 0;
}

/* Numbers of the n at x that were never written, counted from the end. */
ROLN_FN int unused(int n, const roln_real *x)
{
    const roln_real p = poison();
    int i = n;
    while (i > 0 && same(1, x + i - 1, &p)) i--;
    return n - i;
}

/* Checks the guards of all blocks and forgets the blocks. */
ROLN_FN void fresh_done(void)
{
    int i, bad = 0;
    for (i = 0; i < pools; i++)
        bad |= unused(GUARD, pool + pool_at[i] - GUARD) != GUARD || unused(GUARD, pool + pool_at[i] + pool_n[i]) != GUARD;
    CHECK(!bad);
    pools = pool_top = 0;
}

/* ---- long double twins ---- */

#define TN 48 /* largest twin matrix */

ROLN_FN void widen(int n, const roln_real *a, ld *b)
{
    while (n--) b[n] = (ld)a[n];
}

/* Largest |a - b| over largest |b|, with a floor for b = 0; NaN is far away. */
ROLN_FN ld distance(int n, const roln_real *a, const ld *b)
{
    ld d = 0, m = 0;
    int i;
    for (i = 0; i < n; i++) {
        if (!roln_finite(a[i])) return 1e30L;
        if (fabsl((ld)a[i] - b[i]) > d) d = fabsl((ld)a[i] - b[i]);
        if (fabsl(b[i]) > m) m = fabsl(b[i]);
    }
    return d / (m + 1e-3L);
}

ROLN_FN void t_mul(int n, const ld *a, const ld *b, ld *c)
{
    static ld t[TN * TN];
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            ld s = 0;
            for (k = 0; k < n; k++) s += a[i * n + k] * b[k * n + j];
            t[i * n + j] = s;
        }
    memcpy(c, t, (size_t)(n * n) * sizeof *c);
}

/* Solve A X = B for m right-hand sides, X [n][m] in place of B; A is destroyed. */
ROLN_FN void t_solve(int n, int m, ld *A, ld *B)
{
    int i, j, k, p;
    for (k = 0; k < n; k++) {
        for (p = k, i = k + 1; i < n; i++)
            if (fabsl(A[i * n + k]) > fabsl(A[p * n + k])) p = i;
        for (j = 0; j < n; j++) {
            const ld t = A[k * n + j];
            A[k * n + j] = A[p * n + j], A[p * n + j] = t;
        }
        for (j = 0; j < m; j++) {
            const ld t = B[k * m + j];
            B[k * m + j] = B[p * m + j], B[p * m + j] = t;
        }
        for (i = 0; i < n; i++) {
            const ld f = A[i * n + k] / A[k * n + k];
            for (j = 0; j < n && i != k; j++) A[i * n + j] -= f * A[k * n + j];
            for (j = 0; j < m && i != k; j++) B[i * m + j] -= f * B[k * m + j];
        }
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < m; j++) B[i * m + j] /= A[i * n + i];
}

/* exp of any matrix: 2^-s to norm below 1/4, Taylor, s squarings */
ROLN_FN void t_exp(int n, const ld *a, ld *x)
{
    static ld b[TN * TN], t[TN * TN];
    ld norm = 0, f = 1;
    int i, k, s = 0;
    for (i = 0; i < n * n; i++) norm += fabsl(a[i]);
    for (; norm * f > 0.25L; f *= 0.5L) s++;
    for (i = 0; i < n * n; i++) b[i] = a[i] * f, x[i] = t[i] = i % (n + 1) == 0;
    for (k = 1; k < 17; k++) {
        t_mul(n, t, b, t);
        for (i = 0; i < n * n; i++) t[i] /= (ld)k, x[i] += t[i];
    }
    while (s--) t_mul(n, x, x, x);
}

/* cyclic Jacobi: a becomes diagonal, v [n][n] has the eigenvectors in its columns */
ROLN_FN void t_jacobi(int n, ld *a, ld *v)
{
    ld top = 0;
    int i, p, q, sweep;
    for (i = 0; i < n * n; i++) {
        v[i] = i % (n + 1) == 0;
        if (fabsl(a[i]) > top) top = fabsl(a[i]);
    }
    for (sweep = 0; sweep < 40; sweep++)
        for (p = 0; p < n; p++)
            for (q = p + 1; q < n; q++) {
                ld th, t, c, s;
                if (fabsl(a[p * n + q]) <= 1e-24L * top) continue;
                th = (a[q * n + q] - a[p * n + p]) / (2 * a[p * n + q]);
                t = (th < 0 ? -1 : 1) / (fabsl(th) + sqrtl(th * th + 1));
                c = 1 / sqrtl(t * t + 1);
                s = t * c;
                for (i = 0; i < n; i++) {
                    ld x = a[i * n + p], y = a[i * n + q];
                    a[i * n + p] = c * x - s * y, a[i * n + q] = s * x + c * y;
                }
                for (i = 0; i < n; i++) {
                    ld x = a[p * n + i], y = a[q * n + i];
                    a[p * n + i] = c * x - s * y, a[q * n + i] = s * x + c * y;
                    x = v[i * n + p], y = v[i * n + q];
                    v[i * n + p] = c * x - s * y, v[i * n + q] = s * x + c * y;
                }
                a[p * n + q] = a[q * n + p] = 0;
            }
}

ROLN_FN void t_swap(roln_real *a, roln_real *b)
{
    const roln_real t = *a;
    *a = *b, *b = t;
}

/* Eigenvalues of A, ascending, by cyclic Jacobi; for many matrices, hence not in long double where double is enough. */
ROLN_FN void t_eigenvalues(int n, const roln_real *A, t_wide *l)
{
    static t_wide a[TN * TN];
    t_wide top = 0;
    int i, p, q, turned = 1, sweep;
    for (i = 0; i < n * n; i++) {
        a[i] = (t_wide)A[i];
        if (t_abs(a[i]) > top) top = t_abs(a[i]);
    }
    for (sweep = 0; sweep < 60 && turned; sweep++)
        for (turned = 0, p = 0; p < n; p++)
            for (q = p + 1; q < n; q++) {
                const t_wide apq = a[p * n + q];
                t_wide d, r, t, c, s;
                if (t_abs(apq) <= (t_wide)1e-9 * (t_wide)EPS * top) continue;
                d = a[q * n + q] - a[p * n + p], r = t_sqrt(d / top * (d / top) + 4 * (apq / top) * (apq / top)) * top;
                t = 2 * apq / (d < 0 ? d - r : d + r);
                c = 1 / t_sqrt(1 + t * t), s = t * c, turned = 1;
                for (i = 0; i < n; i++) {
                    const t_wide x = a[p * n + i], y = a[q * n + i];
                    a[p * n + i] = c * x - s * y, a[q * n + i] = s * x + c * y;
                }
                for (i = 0; i < n; i++) {
                    const t_wide x = a[i * n + p], y = a[i * n + q];
                    a[i * n + p] = c * x - s * y, a[i * n + q] = s * x + c * y;
                }
                a[p * n + q] = a[q * n + p] = 0;
            }
    for (i = 0; i < n; i++) {
        const t_wide x = a[i * n + i];
        for (p = i; p > 0 && l[p - 1] > x; p--) l[p] = l[p - 1];
        l[p] = x;
    }
}

/* df/dx by central differences of order 8; x is a number that f reads. h^8 / 630 of truncation, about 2e-19 / h of rounding. */
typedef ld (*t_fn)(void *ctx);
ROLN_FN ld t_slope(t_fn f, void *ctx, ld *x, ld h)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    const ld x0 = *x;
    ld sum = 0;
    int k;
    for (k = 1; k <= 4; k++) {
        *x = x0 + (ld)k * h;
        sum += c[k - 1] * f(ctx);
        *x = x0 - (ld)k * h;
        sum -= c[k - 1] * f(ctx);
    }
    *x = x0;
    return sum / h;
}

/* Largest |g_i - df/dx_i| over the largest |df/dx_i|, i < n. */
ROLN_FN ld t_gradient(int n, const roln_real *g, ld *x, ld h, t_fn f, void *ctx)
{
    static ld ref[1000];
    int i;
    for (i = 0; i < n; i++) ref[i] = t_slope(f, ctx, x + i, h);
    return distance(n, g, ref);
}

#ifdef ROLN_DOUBLE
/* The library against itself: central differences of f in every x_i; halving the step quarters the error. */
ROLN_FN void check_halving(int n, const double *g, double *x, double h, double (*f)(void *ctx), void *ctx)
{
    double e[2], sum[2] = {0, 0};
    int i, q;
    for (i = 0; i < n; i++) {
        const double x0 = x[i];
        for (q = 0; q < 2; q++) {
            const double d = q ? h / 2 : h;
            double y;
            x[i] = x0 + d;
            y = f(ctx);
            x[i] = x0 - d;
            e[q] = fabs((y - f(ctx)) / (2 * d) - g[i]);
            x[i] = x0;
            sum[q] += e[q];
        }
        CHECK_BELOW(e[1], 0.27 * e[0] + 1e-13 / h);
    }
    if (sum[0] > 1e-8) CHECK_NEAR(sum[0] / sum[1], 4, 0.1); /* below: f is linear */
}
#endif

#endif
