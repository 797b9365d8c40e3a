/* SPDX-License-Identifier: MIT */
/* charts.h - what the tests of charts share: one shape under test with its sums and calls, random weights and samples of their
   manifold, and what the best decoder leaves of samples, in long double. Include after roln_ae.h or roln.h. */
#ifndef CHARTS_H
#define CHARTS_H

#include "twin.h"
#include "room.h"
#include "curves.h"
#include "numbers.h"

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

#define BENT(n, d) .storage = ROLN_FULL, .bend = &roln_polynomial, .degree = d, .monomials = ROLN_MONOMIALS(n, d)
#define SLOPE ROLN_C(0.5)

/* The shape under test, for the size macros of roln_ae.h. */
static roln_ae ae;
static struct {
    int N, n, N1, N2, ae_sum, monomials, bent, ae_size, keeps;
} of;
#define OF(name) of.name

ROLN_FN void take(const roln_ae *shape)
{
    ae = *shape;
    of.N = ae.size[0], of.n = ae.size[ae.layers], of.N1 = roln_ae_width(&ae, 1), of.N2 = roln_ae_width(&ae, 2);
    of.ae_sum = roln_ae_sum(&ae), of.monomials = ae.monomials, of.bent = roln_ae_bent(&ae), of.ae_size = roln_ae_params(&ae);
    of.keeps = ae.keeps;
}

enum { MAX_SUMS = 20000, MAX_SAMPLES = 3000 };
static double sums[MAX_SUMS];

ROLN_FN roln_status add(const roln_real *th, int count, const roln_real *x, double *to)
{
    const int size = ROLN_CHART_ADD_ROOM(OF);
    const roln_status st = roln_chart_add(&ae, th, count, x, 1, NULL, to, area_of(size), room_of(ROLN_CHART_ADD_WORK(OF)));
    if (st == ROLN_OK && count >= ROLN_CHART_BLOCK) CHECK_AREA(size), CHECK_ROOM();
    ROOM_KEPT();
    return st;
}

ROLN_FN roln_status solve(const double *from, roln_real ridge, roln_real *th, roln_real *residual)
{
    const int size = ROLN_CHART_SOLVE_ROOM(OF);
    const roln_status st = roln_chart_solve(&ae, from, ridge, th, residual, area_of(size));
    if (st == ROLN_OK) CHECK_AREA(size);
    return st;
}

ROLN_FN void clear(double *s)
{
    memset(s, 0, MAX_SUMS * sizeof *s);
}

ROLN_FN int size_of_sums(void)
{
    const int size = ROLN_CHART_SUMS(OF);
    CHECK(size <= MAX_SUMS);
    return size;
}

ROLN_FN void decode(const roln_real *th, int nb, const roln_real *z, roln_real *x)
{
    roln_ae_decode(&ae, 1, nb, th, z, x, spare);
}

ROLN_FN void encode(const roln_real *th, int nb, const roln_real *x, roln_real *z)
{
    roln_ae_encode(&ae, 1, nb, th, x, z, spare);
}

ROLN_FN roln_real *layer_of(roln_real *th)
{
    return th + rolni_bent_at(&ae);
}

/* Biorthogonal weights, W random if it shall be. */
ROLN_FN roln_real *weights_of(int curved, uint64_t *s)
{
    roln_real *th = fresh(of.ae_size), *w = th + of.ae_size - of.monomials * of.bent, top = 100;
    int i, l, at;
    while (top > 4) { /* a well conditioned draw */
        CHECK_OK(roln_ae_init(&ae, th, s, fresh(ROLN_AE_INIT_WORK(OF))));
        for (top = 0, i = 0; i < of.ae_size; i++) top = ROLN_ABS(th[i]) > top ? ROLN_ABS(th[i]) : top;
    }
    for (at = 0, l = 0; l < ae.layers; l++) {
        at += 2 * ae.size[l] * ae.size[l + 1];
        for (i = 0; i < ae.size[l]; i++) th[at++] = ROLN_C(0.3) * roln_normal(s);
    }
    for (i = 0; i < of.monomials * of.bent && curved; i++) w[i] = ROLN_C(0.2) * roln_normal(s);
    return th;
}

/* count states in [-1, 1] */
ROLN_FN void states(int count, uint64_t *s, roln_real *z)
{
    int i;
    for (i = 0; i < count * of.n; i++) z[i] = 2 * roln_uniform(s) - 1;
}

/* largest |a - b| over the largest |b| */
ROLN_FN ld apart(int n, const roln_real *a, const roln_real *b)
{
    return furthest(n, a, b) / (largest(n, b) + 1e-30L);
}

/* ---- samples ------------------------------------------------------------------------------------ */

/* Samples of a random polynomial manifold, noise added; their states too. */
static roln_real samples[MAX_SAMPLES * 16], truth_z[MAX_SAMPLES * 16];
ROLN_FN void manifold(const roln_real *th, int count, double noise, uint64_t *s)
{
    int i;
    CHECK(count <= MAX_SAMPLES);
    states(count, s, truth_z);
    for (i = 0; i < count; i++) decode(th, 1, truth_z + i * of.n, samples + i * of.N);
    for (i = 0; i < count * of.N && noise > 0; i++) samples[i] += (roln_real)noise * roln_normal(s);
}

/* sum |v - C^T f|^2 at its least over C, in long double from the definition, for Psi^T of the bent layer; v [count][N_{L-1}] is its
   input. The layer alone: of.N is N_{L-1} here. */
enum { T_FEATURES = 40 };
ROLN_FN ld t_left(const roln_real *layer, int count, const ld *v, const ld *psi)
{
    static int a[T_CURVES][T_WIDTH];
    static ld P[T_CURVES * T_WIDTH], Pd[T_CURVES * T_WIDTH], zero[T_WIDTH], G[T_FEATURES * T_FEATURES], f[T_FEATURES];
    static ld C[T_FEATURES * T_WIDTH], h[T_FEATURES * T_WIDTH];
    const int m = 1 + of.n + of.monomials, N = of.bent;
    const roln_real *b = layer + 2 * of.n * N;
    ld left = 0;
    int i, j, k;
    CHECK(m <= T_FEATURES && t_exponents(of.n, ae.degree, a) == of.monomials);
    memset(G, 0, sizeof G), memset(h, 0, sizeof h);
    for (k = 0; k < count; k++) {
        for (f[0] = 1, i = 0; i < of.n; i++)
            for (f[1 + i] = 0, j = 0; j < N; j++) f[1 + i] += psi[i * N + j] * (v[k * N + j] - (ld)b[j]);
        t_curves(of.n, of.monomials, a, f + 1, zero, f + 1 + of.n, P, Pd);
        for (i = 0; i < m; i++) {
            for (j = 0; j < m; j++) G[i * m + j] += f[i] * f[j];
            for (j = 0; j < N; j++) h[i * N + j] += f[i] * v[k * N + j];
        }
        for (j = 0; j < N; j++) left += v[k * N + j] * v[k * N + j];
    }
    memcpy(C, h, sizeof C);
    t_solve(m, N, G, C);
    for (i = 0; i < m * N; i++) left -= C[i] * h[i];
    return left;
}

#endif
