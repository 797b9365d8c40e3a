/* SPDX-License-Identifier: MIT */
/* Charts with a linear encoder (roln_ae.h, sections 3 and 10): the polynomials against their definition, the left inverse for
   any W, the fit in closed form against known manifolds and a slow fit in long double, the derivative of what it leaves, data
   that do not suffice. Of a model: test_chart_model.c; jets, backward and stored weights of the bent layer: test_ae.c,
   test_ae_stored.c. */
#include "roln_ae.h"
#include "charts.h"

void TEST_NAME(chart)(void);

static double other[MAX_SUMS];

/* ---- polynomials -------------------------------------------------------------------------------- */

static void test_count(void)
{
    int n, d, e;
    for (n = 1; n <= 12; n++)
        for (d = 1; d <= ROLN_DEGREE_MAX; d++) { /* (n + d choose d) by Pascal's triangle */
            long row[32] = {1};
            int i;
            for (i = 1; i <= n + d; i++)
                for (e = i; e > 0; e--) row[e] += row[e - 1];
            CHECK(ROLN_MONOMIALS(n, d) == (int)row[d] - 1 - n);
        }
    CHECK(ROLN_MONOMIALS(600, 0) == 0 && ROLN_MONOMIALS(65535, 0) == 0 && ROLN_MONOMIALS(600, 2) == 600 * 601 / 2);
}

/* The twin's T_k is cos(k acos x), its derivatives are those. */
static void test_twin(void)
{
    int k, i;
    for (k = 0; k <= ROLN_DEGREE_MAX; k++)
        for (i = -20; i <= 20; i++) {
            const ld x = i / 20.L, h = 1e-5L;
            ld t[3], up[3], down[3];
            t_chebyshev(k, x, t), t_chebyshev(k, x + h, up), t_chebyshev(k, x - h, down);
            CHECK_NEAR(t[0], cosl((ld)k * acosl(x)), 1e-15L);
            CHECK_NEAR(t[1], (up[0] - down[0]) / (2 * h), 1e-6L);
            CHECK_NEAR(t[2], (up[1] - down[1]) / (2 * h), 1e-4L);
        }
}

/* p and its rates along a line, in the stated order, of n variables to degree d. */
static void check_polynomials(int n, int d, uint64_t *s)
{
    static int a[T_CURVES][T_WIDTH];
    static ld p[T_CURVES], P[T_CURVES * T_WIDTH], Pd[T_CURVES * T_WIDTH], ref[4][T_CURVES];
    static const char *const what[3] = {"polynomials (eps d^2)", "their rate (eps d^2 n)", "its rate (eps d^4 n^2)"};
    const int m = ROLN_MONOMIALS(n, d);
    roln_real *z = fresh(3 * n), *got = fresh(3 * m), *one = fresh(m), *along[3] = {fresh(m), fresh(m), fresh(m)};
    const roln_real *const x[2] = {z + n, z + 2 * n}, *const px[2] = {along[0], along[1]};
    rolni_powers t = rolni_first_powers();
    ld zl[3 * T_WIDTH];
    int i, k, j;
    for (i = 0; i < 3 * n; i++) z[i] = 2 * roln_uniform(s) - 1;
    if (roln_rand(s) % 4 == 0) z[0] = roln_rand(s) % 2 ? 1 : -1; /* the ends */
    widen(3 * n, z, zl);
    CHECK(t_exponents(n, d, a) == m);
    t_curves(n, m, a, zl, zl + n, p, P, Pd);
    for (k = 0; k < m; k++)
        for (ref[0][k] = p[k], ref[1][k] = ref[2][k] = ref[3][k] = 0, i = 0; i < n; i++) {
            ref[1][k] += P[k * n + i] * zl[n + i], ref[3][k] += Pd[k * n + i] * zl[2 * n + i];
            ref[2][k] += P[k * n + i] * zl[2 * n + i] + Pd[k * n + i] * zl[n + i];
        }
    for (k = 0; k < n + m; k++, rolni_next_powers(n, &t))
        for (i = 0; i < n; i++) CHECK(t.power[i] == (k < n ? i == k : a[k - n][i]));
    rolni_polynomials(n, d, 3, z, n, got, m);
    for (j = 0; j < 3; j++)
        for (k = 0; k < m; k++) /* on [-1, 1]^n they are at most 1, d^2 n, d^4 n^2 */
            BOUND(what[j], fabsl((ld)got[j * m + k] - ref[j][k]) / EPS / powl((ld)(d * d * (j ? n : 1)), j > 1 ? 2 : 1), 2);
    rolni_polynomials(n, d, 1, z, n, one, m);
    CHECK(same(m, got, one));
    for (j = 0; j < 2; j++) rolni_polynomials_along(n, d, z, one, x[j], along[j]);
    rolni_polynomials_mixed(n, d, z, one, x, px, along[2]);
    for (k = 0; k < m; k++) {
        BOUND("their derivative along x (eps d^2 n)", fabsl((ld)along[0][k] - ref[1][k]) / EPS / (ld)(d * d * n), 2);
        BOUND("the second along x, y (eps d^4 n^2)", fabsl((ld)along[2][k] - ref[3][k]) / EPS / powl((ld)(d * d * n), 2), 2);
    }
    rolni_polynomials(n, d, 2, z, n, zeros(2 * m), m);
    fresh_done();
}

/* ---- the left inverse --------------------------------------------------------------------------- */

enum { MOST = 600000 };
static roln_real large[MOST], large_tape[100000];

/* rho(phi(z)) = z for a random W, against what the sums of the encoder add up. outer: a layer with an activation before. */
static void check_left_inverse(int n, int d, int outer, uint64_t *s)
{
    const roln_ae plain = {.layers = 1, .size = {n + 2, n}, .slope = 1, BENT(n, d)};
    const roln_ae deep = {.layers = 2, .size = {n + 3, n + 2, n}, .slope = SLOPE, BENT(n, d)};
    roln_real z[16], x[16], back[16], *th, *layer;
    ld worst = 0, terms = 0;
    int i, j;
    take(outer ? &deep : &plain);
    CHECK(of.ae_size <= MOST && ROLN_AE_DECODE_TAPE(OF, 1, 1) <= (int)(sizeof large_tape / sizeof *large_tape));
    do CHECK_OK(roln_ae_init(&ae, large, s, fresh(ROLN_AE_INIT_WORK(OF))));
    while (largest(of.ae_size, large) > 4);
    fresh_done();
    th = large, layer = layer_of(th);
    for (i = 0; i < of.monomials * of.bent; i++) layer[(2 * n + 1) * of.bent + i] = roln_normal(s) / (roln_real)n;
    states(1, s, z);
    roln_ae_decode(&ae, 1, 1, th, z, x, large_tape);
    roln_ae_encode(&ae, 1, 1, th, x, back, large_tape);
    for (j = 0; j < n; j++) { /* by the terms of Psi^T (x - b) of the bent layer, or of the layer before, whose activation adds */
        ld sum = 0;
        for (i = 0; i < of.bent; i++) sum += fabsl((ld)layer[(n + j) * of.bent + i]);
        terms = sum > terms ? sum : terms;
    }
    for (worst = 0, j = 0; j < n; j++) worst = fabsl((ld)back[j] - (ld)z[j]) > worst ? fabsl((ld)back[j] - (ld)z[j]) : worst;
    BOUND(outer ? "left inverse behind a layer (eps of terms)" : "left inverse (eps of terms)",
          worst / (terms * (1 + largest(of.N, x)) * EPS), outer ? 15 : 10);
}

/* ---- the fit ------------------------------------------------------------------------------------ */

/* The pair is biorthogonal, and Psi^T W^T = 0. */
static void check_pair(roln_real *th)
{
    const roln_real *phi = layer_of(th), *psi = phi + of.n * of.bent, *W = psi + (of.n + 1) * of.bent;
    int i, j, k;
    for (i = 0; i < of.n; i++)
        for (j = 0; j < of.n + of.monomials; j++) {
            const roln_real *row = j < of.n ? phi + j * of.bent : W + (j - of.n) * of.bent;
            ld sum = j < of.n ? -(ld)(i == j) : 0, size = 1e-3L;
            for (k = 0; k < of.bent; k++) {
                sum += (ld)psi[i * of.bent + k] * (ld)row[k];
                size += fabsl((ld)psi[i * of.bent + k] * (ld)row[k]);
            }
            if (j < of.n) BOUND("fit: Psi^T Phi = I (eps of terms)", fabsl(sum) / (size * EPS), 2);
            else BOUND("fit: Psi^T W^T = 0 (eps of terms)", fabsl(sum) / (size * EPS), 2);
        }
}

/* A manifold that the chart can be is found again, whatever Phi and W were. */
static void check_recovery(const roln_ae *shape, int count, uint64_t *s)
{
    roln_real *th, *found, *z, *x, *y, left = 7;
    int i;
    take(shape);
    th = weights_of(1, s), found = copy(of.ae_size, th);
    for (i = 0; i < of.n * of.bent; i++) layer_of(found)[i] += roln_normal(s); /* Phi, which the fit does not read */
    for (i = 0; i < of.monomials * of.bent; i++) layer_of(found)[(2 * of.n + 1) * of.bent + i] = roln_normal(s);
    manifold(th, count, 0, s);
    clear(sums);
    CHECK_OK(add(found, count, samples, sums));
    CHECK_NEAR(sums[0], count, 0);
    CHECK_OK(solve(sums, 0, found, &left));
    BOUND("fit: what is left of a polynomial manifold", left, PICK(3e-6L, 1e-7L));
    check_pair(found);
    z = fresh(50 * of.n), x = fresh(50 * of.N), y = fresh(50 * of.N);
    states(50, s, z);
    decode(th, 50, z, x), decode(found, 50, z, y);
    BOUND("fit: a polynomial manifold again (eps)", apart(50 * of.N, y, x) / EPS, PICK(50, 150));
    CHECK_OK(add(found, count, samples, sums)); /* sums stay good behind a solve */
    CHECK_OK(solve(sums, 0, found, &left));
    decode(found, 50, z, y);
    BOUND("fit: a polynomial manifold again (eps)", apart(50 * of.N, y, x) / EPS, PICK(50, 150));
    fresh_done();
}

/* Features and target of sample i in long double, from the definition. Shapes of one layer. */
static void t_features(const roln_real *th, const roln_real *x, int m, ld *f)
{
    static int a[T_CURVES][T_WIDTH];
    static ld P[T_CURVES * T_WIDTH], Pd[T_CURVES * T_WIDTH], zero[T_WIDTH];
    const roln_real *psi = th + of.n * of.N, *b = psi + of.n * of.N;
    int i, j;
    CHECK(t_exponents(of.n, ae.degree, a) == of.monomials && m == 1 + of.n + of.monomials);
    for (f[0] = 1, i = 0; i < of.n; i++)
        for (f[1 + i] = 0, j = 0; j < of.N; j++) f[1 + i] += (ld)psi[i * of.N + j] * ((ld)x[j] - (ld)b[j]);
    t_curves(of.n, of.monomials, a, f + 1, zero, f + 1 + of.n, P, Pd);
}

/* Noisy samples, with a ridge: the coefficients and what is left are those of the slow fit. */
static void check_slow(const roln_ae *shape, int count, roln_real ridge, uint64_t *s)
{
    enum { M = 40 };
    static ld G[M * M], C[M * T_WIDTH], f[M];
    roln_real *th, *got, left = 7;
    ld sum = 0, all = 0, mean[T_WIDTH] = {0};
    int i, j, k, m;
    take(shape);
    m = 1 + of.n + of.monomials;
    CHECK(m <= M && ae.layers == 1);
    th = weights_of(1, s), got = copy(of.ae_size, th);
    manifold(th, count, 0.1, s);
    clear(sums);
    CHECK_OK(add(th, count, samples, sums));
    CHECK_OK(solve(sums, ridge, got, &left));
    memset(G, 0, sizeof G), memset(C, 0, sizeof C);
    for (k = 0; k < count; k++) {
        t_features(th, samples + k * of.N, m, f);
        for (i = 0; i < m; i++) {
            for (j = 0; j < m; j++) G[i * m + j] += f[i] * f[j];
            for (j = 0; j < of.N; j++) C[i * of.N + j] += f[i] * (ld)samples[k * of.N + j];
        }
        for (j = 0; j < of.N; j++) mean[j] += (ld)samples[k * of.N + j] / count;
    }
    for (i = 1 + of.n; i < m; i++) G[i * (m + 1)] += (ld)ridge * count;
    t_solve(m, of.N, G, C);
    for (k = 0; k < count; k++) {
        t_features(th, samples + k * of.N, m, f);
        for (j = 0; j < of.N; j++) {
            ld d = (ld)samples[k * of.N + j];
            all += (d - mean[j]) * (d - mean[j]);
            for (i = 0; i < m; i++) d -= C[i * of.N + j] * f[i];
            sum += d * d;
        }
    }
    BOUND("fit: coefficients of the slow fit (eps)", distance(of.N, got + 2 * of.n * of.N, C) / EPS, PICK(10, 150));
    BOUND("fit: coefficients of the slow fit (eps)", distance(of.n * of.N, got, C + of.N) / EPS, PICK(10, 150));
    BOUND("fit: coefficients of the slow fit (eps)",
          distance(of.monomials * of.N, got + (2 * of.n + 1) * of.N, C + (1 + of.n) * of.N) / EPS, PICK(10, 150));
    CHECK_NEAR(left, sqrtl(sum / all), 1e-5L * sqrtl(sum / all));
    check_pair(got);
    fresh_done();
}

/* Blocks and vectors do not show: the sums are those of a loop over samples in double, bit for bit, in whatever portions. */
static void check_portions(const roln_ae *shape, int count, uint64_t *s)
{
    static double slow[MAX_SUMS];
    roln_real *th, *z, *p;
    int k, i, j, m, size, at;
    take(shape);
    m = 1 + of.n + of.monomials, size = size_of_sums();
    th = weights_of(1, s), z = fresh(of.n), p = fresh(of.monomials);
    manifold(th, count, 0.1, s);
    clear(sums), clear(slow);
    CHECK_OK(add(th, count, samples, sums));
    CHECK(unused(0, z) == 0);
    for (k = 0; k < count; k++) {
        const roln_real *b = layer_of(th) + 2 * of.n * of.bent, *in = spare + 2 * of.ae_sum - of.n;
        double f[40];
        encode(th, 1, samples + k * of.N, z);
        rolni_polynomials(of.n, ae.degree, 1, z, 1, p, 1);
        for (f[0] = 1, i = 1; i < m; i++) f[i] = (double)(i <= of.n ? z[i - 1] : p[i - 1 - of.n]);
        if (ae.layers > 1) in = spare + 2 * (of.ae_sum - of.n) - of.bent;
        for (at = 0, i = 0; i < m; i++)
            for (j = 0; j <= i; j++) slow[at++] += f[i] * f[j];
        for (i = 0; i < m; i++)
            for (j = 0; j < of.bent; j++) slow[at++] += f[i] * ((double)in[j] + (double)b[j]);
        for (j = 0; j < of.bent; j++) slow[at] += ((double)in[j] + (double)b[j]) * ((double)in[j] + (double)b[j]);
    }
    CHECK(at + 1 == size && memcmp(sums, slow, (size_t)size * sizeof *sums) == 0);
    clear(other);
    for (k = 0; k < count; k += j) {
        j = 1 + roln_randint(20, s);
        j = j < count - k ? j : count - k;
        CHECK_OK(add(th, j, samples + k * of.N, other));
    }
    CHECK(memcmp(sums, other, (size_t)size * sizeof *sums) == 0);
    CHECK_OK(add(th, 0, NULL, other));
    CHECK(memcmp(sums, other, MAX_SUMS * sizeof *sums) == 0); /* and nothing behind them */
    fresh_done();
}

/* Eight parts of the data, each summed for itself and merged: the same but for rounding, and the same bits again. */
static void check_eight(const roln_ae *shape, uint64_t *s)
{
    enum { PARTS = 8, EACH = 120 };
    static double merged[MAX_SUMS];
    roln_real *th, *whole, *split, left = 7, left_split = 7;
    int size, i, pass;
    take(shape);
    size = size_of_sums();
    th = weights_of(1, s), whole = copy(of.ae_size, th), split = copy(of.ae_size, th);
    manifold(th, PARTS * EACH, 0.1, s);
    clear(sums);
    CHECK_OK(add(th, PARTS * EACH, samples, sums));
    for (pass = 0; pass < 2; pass++) {
        clear(merged);
        for (i = 0; i < PARTS; i++) {
            clear(other);
            CHECK_OK(add(th, EACH, samples + i * EACH * of.N, other));
            roln_chart_merge(size, other, merged);
        }
        if (pass == 0) memcpy(area, merged, sizeof area), memcpy(large, area, sizeof area);
    }
    CHECK(memcmp(merged, large, (size_t)size * sizeof *merged) == 0);
    for (i = 0; i < size; i++) CHECK_NEAR(merged[i], sums[i], 1e-11 * PARTS * EACH);
    CHECK_OK(solve(sums, 0, whole, &left));
    CHECK_OK(solve(merged, 0, split, &left_split));
    BOUND("fit: eight parts (eps)", apart(of.ae_size, split, whole) / EPS, PICK(1, 40));
    CHECK_NEAR(left, left_split, PICK(1e-6, 1e-12));
    fresh_done();
}

/* States on a surface, but for a little, on which many polynomials are nearly one: the residual is still that of the decoder, z
   does not move, and with the usual ridge the fit is as good, of smaller weights. */
static void test_surface(uint64_t *s)
{
    enum { COUNT = 800 };
    const roln_ae shape = {.layers = 1, .size = {7, 3}, .slope = 1, BENT(3, 3)};
    roln_real *th, *z, *y, *b, left[2], size[2];
    int pass, k, i;
    take(&shape);
    th = weights_of(1, s), z = fresh(COUNT * of.n), y = fresh(COUNT * of.N), b = copy(of.N, th + 6 * of.N);
    states(COUNT, s, z);
    for (k = 0; k < COUNT; k++) z[3 * k + 2] = (z[3 * k] + z[3 * k + 1]) / 2 + ROLN_C(0.02) * roln_normal(s);
    decode(th, COUNT, z, samples);
    for (i = 0; i < COUNT * of.N; i++) samples[i] += ROLN_C(0.01) * roln_normal(s);
    clear(sums);
    CHECK_OK(add(th, COUNT, samples, sums));
    for (pass = 0; pass < 2; pass++) {
        ld off = 0, mean[8] = {0}, all = 0;
        CHECK_OK(solve(sums, pass ? ROLN_CHART_RIDGE : 0, th, left + pass));
        encode(th, COUNT, samples, z), decode(th, COUNT, z, y);
        for (i = 0; i < COUNT * of.N; i++) mean[i % of.N] += (ld)samples[i] / COUNT;
        for (i = 0; i < COUNT * of.N; i++) {
            off += ((ld)y[i] - (ld)samples[i]) * ((ld)y[i] - (ld)samples[i]);
            all += ((ld)samples[i] - mean[i % of.N]) * ((ld)samples[i] - mean[i % of.N]);
        }
        BOUND("fit: on a surface, decoder over residual", fabsl(sqrtl(off / all) / left[pass] - 1), PICK(1e-4L, 1e-7L));
        size[pass] = roln_dot(of.monomials * of.N, th + 7 * of.N, th + 7 * of.N);
        check_pair(th);
        for (k = 0; k < of.n; k++) { /* Psi^T b is what it was */
            ld moved = 0, terms = 0;
            for (i = 0; i < of.N; i++) {
                const ld p = (ld)th[(3 + k) * of.N + i];
                moved += p * ((ld)th[6 * of.N + i] - (ld)b[i]), terms += fabsl(p * (ld)th[6 * of.N + i]);
            }
            BOUND("fit: on a surface, Psi^T b (eps of terms)", fabsl(moved) / (terms * EPS), 1);
        }
    }
    CHECK(size[1] < size[0] / 2 && left[1] < ROLN_C(1.01) * left[0]);
    fresh_done();
}

/* The derivative of the least sum by Psi, against central differences: halving the step quarters their distance from it. */
static void check_grad(const roln_ae *shape, uint64_t *s)
{
    enum { COUNT = 60 };
    static ld v[COUNT * T_WIDTH], psi[T_WIDTH * T_WIDTH];
    roln_real *th, *z, *g, left = 7;
    const roln_real *in, *layer;
    double sum = 0;
    ld size = 0, off[2], exact;
    int i, k, half;
    take(shape);
    th = weights_of(1, s), z = fresh(COUNT * of.n), g = zeros(of.n * of.bent);
    manifold(th, COUNT, 0.1, s);
    clear(sums);
    CHECK_OK(add(th, COUNT, samples, sums));
    CHECK_OK(solve(sums, 0, th, &left));
    layer = layer_of(th);
    in = rolni_chart_encode(&ae, th, COUNT, samples, 1, NULL, z, spare);
    for (i = 0; i < COUNT * of.bent; i++) v[i] = (ld)in[i] + (ld)layer[2 * of.n * of.bent + i % of.bent];
    for (k = 0; k < COUNT; k += 4) /* in parts, x in other units */
        for (i = 0; i < 4 * of.N; i++) samples[k * of.N + i] *= 4;
    for (k = 0; k < COUNT; k += 4)
        roln_chart_grad(&ae, th, 4, samples + k * of.N, ROLN_C(0.25), &sum, g, room_of(ROLN_CHART_GRAD_WORK(OF, 4))), CHECK_ROOM();
    widen(of.n * of.bent, layer + of.n * of.bent, psi);
    exact = t_left(layer, COUNT, v, psi);
    BOUND("encoder: what is left (eps)", fabsl((ld)sum / exact - 1) / EPS, PICK(5, 20));
    for (i = 0; i < of.n * of.bent; i++) size += (ld)g[i] * (ld)g[i];
    for (i = 0; i < of.n * of.bent; i++) {
        const ld was = psi[i], rms = sqrtl(size / (of.n * of.bent));
        for (half = 0; half < 2; half++) {
            const ld h = half ? 5e-5L : 1e-4L;
            ld up, down;
            psi[i] = was + h, up = t_left(layer, COUNT, v, psi);
            psi[i] = was - h, down = t_left(layer, COUNT, v, psi);
            psi[i] = was;
            off[half] = ((up - down) / (2 * h) - (ld)g[i]) / rms;
        }
        BOUND("encoder: slope (eps)", fabsl((4 * off[1] - off[0]) / 3) / EPS, PICK(5000, 3e5L));
        if (fabsl(off[0]) > 1e4L * EPS) BOUND("encoder: the error of differences, quartered", fabsl(off[0] / off[1] - 4), 0.5L);
    }
    fresh_done();
}

/* ---- data that do not suffice ------------------------------------------------------------------- */

/* A solve that must be refused, and writes nothing. */
static void refused(const double *from, roln_real ridge, roln_status want, roln_real *th)
{
    const roln_real *before = copy(of.ae_size, th);
    roln_real left = 7;
    CHECK(solve(from, ridge, th, &left) == want);
    CHECK(same(of.ae_size, before, th) && all(1, &left, 7));
}

static void test_ill(uint64_t *s)
{
    const roln_ae shape = {.layers = 1, .size = {7, 3}, .slope = 1, BENT(3, 3)};
    const roln_ae flat = {.layers = 1, .size = {7, 3}, .slope = 1, BENT(3, 2)};
    roln_real *th, *x, left = 7;
    int m, i, k, count;
    take(&shape);
    m = 1 + of.n + of.monomials;
    th = weights_of(1, s);
    manifold(th, 400, 0.05, s);
    clear(sums);
    refused(sums, 0, ROLN_E_LENGTH, th);
    for (count = 1; count < m; count += 3) { /* too few */
        clear(sums);
        CHECK_OK(add(th, count, samples, sums));
        refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
    }
    clear(sums);
    CHECK_OK(add(th, m - 1, samples, sums));
    refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
    for (i = 0; i < 50; i++) CHECK_OK(add(th, m - 1, samples, sums)); /* the same again and again */
    refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
    CHECK_OK(solve(sums, ROLN_C(1e-4), copy(of.ae_size, th), &left)); /* a ridge chooses among what they allow */
    CHECK_OK(add(th, 40, samples + m * of.N, sums));
    CHECK_OK(solve(sums, 0, copy(of.ae_size, th), &left));
    clear(sums); /* a coordinate that is a constant joint */
    x = copy(400 * of.N, samples);
    for (i = 0; i < of.N; i++) th[of.n * of.N + i] = i == 2;
    for (k = 0; k < 400; k++) x[k * of.N + 2] = ROLN_C(0.7);
    CHECK_OK(add(th, 400, x, sums));
    refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
    refused(sums, ROLN_C(1e-3), ROLN_E_ILL_CONDITIONED, th);
    fresh_done();

    for (k = 0; k < 4; k++) { /* two coordinates that are one, but for rounding */
        static const roln_real times[4] = {2, ROLN_C(1.7), ROLN_C(0.3), ROLN_C(-1.1)};
        th = weights_of(1, s);
        for (i = 0; i < of.N; i++) th[(of.n + 1) * of.N + i] = times[k] * th[of.n * of.N + i];
        clear(sums);
        CHECK_OK(add(th, 400, samples, sums));
        refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
        refused(sums, ROLN_C(1e-3), ROLN_E_ILL_CONDITIONED, th);
        fresh_done();
    }

    take(&flat); /* n too large: data of two dimensions */
    th = weights_of(0, s);
    x = fresh(400 * of.N);
    for (k = 0; k < 400; k++) {
        const roln_real a = 2 * roln_uniform(s) - 1, b = 2 * roln_uniform(s) - 1;
        for (i = 0; i < of.N; i++) x[k * of.N + i] = a * (roln_real)cos(i) + b * (roln_real)sin(2 * i + 1);
    }
    clear(sums);
    CHECK_OK(add(th, 400, x, sums));
    refused(sums, 0, ROLN_E_ILL_CONDITIONED, th);
    CHECK(roln_ae_init_pod(&ae, 400, x, 1, NULL, copy(of.ae_size, th), area, fresh(ROLN_AE_POD_WORK(OF))) ==
          ROLN_E_ILL_CONDITIONED);
    fresh_done();
}

/* A joint that does not move is no obstacle behind the POD start, and stays where it is. */
static void test_constant_joint(uint64_t *s)
{
    const roln_ae shape = {.layers = 1, .size = {7, 3}, .slope = 1, BENT(3, 3)};
    roln_real *th, *fit, *x, *y, *z, left = 7;
    int k;
    take(&shape);
    th = weights_of(1, s), fit = fresh(of.ae_size);
    manifold(th, 600, 0, s);
    x = copy(600 * of.N, samples);
    for (k = 0; k < 600; k++) x[k * of.N + 4] = ROLN_C(0.7);
    CHECK_OK(roln_ae_init_pod(&ae, 600, x, 1, NULL, fit, area, fresh(ROLN_AE_POD_WORK(OF))));
    clear(sums);
    CHECK_OK(add(fit, 600, x, sums));
    CHECK_OK(solve(sums, 0, fit, &left));
    z = fresh(600 * of.n), y = fresh(600 * of.N);
    encode(fit, 600, x, z), decode(fit, 600, z, y);
    for (k = 0; k < 600; k++) CHECK_NEAR(y[k * of.N + 4], 0.7, PICK(30 * EPS, 1e-11));
    CHECK(left > 0 && left < 1);
    fresh_done();
}

/* Samples that are not finite, sums that are not, settings that make no sense. */
static void test_failures(uint64_t *s)
{
    const roln_ae shape = {.layers = 2, .size = {6, 5, 2}, .slope = SLOPE, BENT(2, 4)};
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, PICK(1e30f, 1e200)}; /* the last overflows in p */
    roln_real *th, left = 7;
    roln_ae none;
    int size, i, j, at;
    take(&shape);
    size = size_of_sums();
    th = weights_of(1, s);
    manifold(th, 100, 0.05, s);
    for (j = 0; j < 3; j++)
        for (at = 0; at < 30; at++) { /* those before it are added, it and those behind it are not */
            const int k = at * of.N + at % of.N;
            const roln_real was = samples[k];
            clear(sums), clear(other);
            samples[k] = bad[j];
            CHECK(add(th, 100, samples, sums) == ROLN_E_NOT_FINITE);
            samples[k] = was;
            CHECK_OK(add(th, at, samples, other));
            CHECK(memcmp(sums, other, (size_t)size * sizeof *sums) == 0);
        }
    clear(sums);
    CHECK_OK(add(th, 100, samples, sums));
    memcpy(other, sums, sizeof other);
    CHECK(add(th, -1, samples, sums) == ROLN_E_LENGTH);
    for (i = 0; i < size; i++) {
        for (j = 0; j < 2; j++) {
            other[i] = j ? (double)NAN : (double)INFINITY;
            refused(other, 0, ROLN_E_NOT_FINITE, th);
            fresh_done();
            th = copy(of.ae_size, th);
        }
        other[i] = sums[i];
    }
    refused(sums, -ROLN_C(1e-3), ROLN_E_RANGE, th);
    refused(sums, (roln_real)NAN, ROLN_E_NOT_FINITE, th), refused(sums, (roln_real)INFINITY, ROLN_E_NOT_FINITE, th);
    none = ae, none.bend = ROLN_UNBENT, none.degree = none.monomials = 0;
    CHECK(roln_chart_add(&none, th, 100, samples, 1, NULL, sums, area, spare) == ROLN_E_SHAPE);
    CHECK(roln_chart_solve(&none, sums, 0, th, &left, area) == ROLN_E_SHAPE && all(1, &left, 7));
    CHECK(roln_chart_center(&none, samples, samples, th) == ROLN_E_SHAPE);
#ifndef ROLN_DOUBLE
    none = ae, none.storage = &roln_half;
    CHECK(roln_chart_add(&none, th, 100, samples, 1, NULL, sums, area, spare) == ROLN_E_SHAPE);
    CHECK(roln_chart_solve(&none, sums, 0, th, &left, area) == ROLN_E_SHAPE && all(1, &left, 7));
    CHECK(roln_chart_center(&none, samples, samples, th) == ROLN_E_SHAPE);
#endif
    CHECK(memcmp(other, sums, sizeof other) == 0);
    fresh_done();
}

/* The more ridge, the less W and the more is left; the pair stays biorthogonal. */
static void test_ridge(uint64_t *s)
{
    const roln_ae shape = {.layers = 1, .size = {6, 2}, .slope = 1, BENT(2, 4)};
    roln_real *th, *w, left = 0, last = 0, ridge;
    ld size = 0, size_last = 1e30L;
    int i;
    take(&shape);
    th = weights_of(1, s), w = layer_of(th) + 5 * of.N;
    manifold(th, 500, 0.05, s);
    clear(sums);
    CHECK_OK(add(th, 500, samples, sums));
    for (ridge = ROLN_C(1e-4); ridge < ROLN_C(1e5); ridge *= 10) {
        CHECK_OK(solve(sums, ridge, th, &left));
        check_pair(th);
        for (size = 0, i = 0; i < of.monomials * of.N; i++) size += (ld)w[i] * (ld)w[i];
        CHECK(size < size_last && left >= last);
        size_last = size, last = left;
    }
    CHECK_BELOW(size, 1e-7);
    fresh_done();
}

/* ---- coordinates -------------------------------------------------------------------------------- */

/* The same encoder in other units, the same linear decoder. */
static void check_center(const roln_ae *shape, uint64_t *s)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    const roln_real far_off = (roln_real)(sizeof(roln_real) == 4 ? 1.8e19 : 1.3e154); /* squared nearly the largest number */
    roln_real lo[8], hi[8], *th, *new_th, *z, *z1, *x, *x1, *before, w;
    int i, j, k;
    take(shape);
    th = weights_of(0, s), new_th = copy(of.ae_size, th);
    for (i = 0; i < of.n; i++) lo[i] = roln_normal(s), hi[i] = lo[i] + ROLN_C(0.1) + roln_uniform(s);
    layer_of(new_th)[(2 * of.n + 1) * of.bent] = 5; /* of W */
    CHECK_OK(roln_chart_center(&ae, lo, hi, new_th));
    CHECK_OK(roln_ae_check(&ae, new_th));
    for (i = 0; i < of.monomials * of.bent; i++) CHECK(all(1, layer_of(new_th) + (2 * of.n + 1) * of.bent + i, 0));
    z = normal(20 * of.n, 1, s), z1 = fresh(20 * of.n), x = fresh(20 * of.N), x1 = fresh(20 * of.N);
    for (k = 0; k < 20; k++)
        for (i = 0; i < of.n; i++) z1[k * of.n + i] = (z[k * of.n + i] - (hi[i] + lo[i]) / 2) / ((hi[i] - lo[i]) / 2);
    decode(th, 20, z, x), decode(new_th, 20, z1, x1);
    BOUND("center: decoder (eps)", apart(20 * of.N, x1, x) / EPS, 8);
    encode(th, 20, x, z), encode(new_th, 20, x, x1);
    for (k = 0; k < 20; k++)
        for (i = 0; i < of.n; i++) z1[k * of.n + i] = (z[k * of.n + i] - (hi[i] + lo[i]) / 2) / ((hi[i] - lo[i]) / 2);
    BOUND("center: encoder (eps)", apart(20 * of.n, x1, z1) / EPS, 20);

    before = copy(of.ae_size, th);
#define REFUSED(want) CHECK(roln_chart_center(&ae, lo, hi, th) == want && same(of.ae_size, th, before))
    for (i = 0; i < 2 * of.n; i++) {
        roln_real *number = i < of.n ? lo + i : hi + i - of.n;
        w = *number;
        for (j = 0; j < 3; j++) {
            *number = bad[j];
            REFUSED(ROLN_E_NOT_FINITE);
        }
        *number = i < of.n ? hi[i] : lo[i - of.n];
        REFUSED(ROLN_E_RANGE);
        *number += i < of.n ? 1 : -1;
        REFUSED(ROLN_E_RANGE);
        *number = w;
        if (of.n == 1) continue;
        *number = i < of.n ? hi[i] - 2 * ROLN_EPS * ROLN_ABS(hi[i]) : lo[i - of.n] + 2 * ROLN_EPS * ROLN_ABS(lo[i - of.n]);
        REFUSED(ROLN_E_ILL_CONDITIONED);
        *number = w;
    }
    for (i = 0; i < of.n; i++) lo[i] = 0, hi[i] = 1 / far_off; /* Psi in these units overflows */
    layer_of(th)[of.n * of.bent] = layer_of(before)[of.n * of.bent] = far_off;
    REFUSED(ROLN_E_NOT_FINITE);
    for (i = 0; i < of.n; i++) lo[i] = far_off * (far_off / 128), hi[i] = lo[i] * (1 + ROLN_C(0.0078125)); /* b does */
    layer_of(th)[0] = layer_of(before)[0] = 1024;
    REFUSED(ROLN_E_NOT_FINITE);
    fresh_done();
}

/* The POD start: the samples fill [-1, 1], reconstruction is that of the same start without a bend. */
static void check_pod(const roln_ae *shape, uint64_t *s)
{
    roln_ae straight = *shape;
    roln_real *th, *plain, *z, *x, *y, *before, lo[8], hi[8];
    int i, k;
    take(shape);
    th = weights_of(1, s);
    manifold(th, 300, 0.01, s);
    x = copy(300 * of.N, samples), z = fresh(300 * of.n), y = fresh(300 * of.N), plain = fresh(of.ae_size);
    for (i = 0; i < 300 * of.N; i++) x[i] /= 4;
    CHECK_OK(roln_ae_init_pod(&ae, 300, x, 4, NULL, th, area_of(ROLN_AE_POD_ROOM(OF)), room_of(ROLN_AE_POD_WORK(OF))));
    CHECK_ROOM(), CHECK_AREA(ROLN_AE_POD_ROOM(OF));
    CHECK_OK(roln_ae_check(&ae, th));
    encode(th, 300, samples, z);
    for (i = 0; i < of.n; i++) {
        lo[i] = 9, hi[i] = -9;
        for (k = 0; k < 300; k++) {
            lo[i] = z[k * of.n + i] < lo[i] ? z[k * of.n + i] : lo[i];
            hi[i] = z[k * of.n + i] > hi[i] ? z[k * of.n + i] : hi[i];
        }
        CHECK_NEAR(lo[i], -1, 100 * EPS), CHECK_NEAR(hi[i], 1, 100 * EPS);
    }
    straight.bend = ROLN_UNBENT, straight.degree = straight.monomials = 0;
    CHECK_OK(roln_ae_init_pod(&straight, 300, x, 4, NULL, plain, area, fresh(ROLN_AE_POD_WORK(OF))));
    decode(th, 300, z, y);
    roln_ae_encode(&straight, 1, 300, plain, samples, z, spare), roln_ae_decode(&straight, 1, 300, plain, z, x, spare);
    BOUND("POD start of a chart (eps)", apart(300 * of.N, y, x) / EPS, 10);
    before = copy(of.ae_size, th); /* fewer samples than directions */
    CHECK(roln_ae_init_pod(&ae, of.n, samples, 1, NULL, th, area, fresh(ROLN_AE_POD_WORK(OF))) == ROLN_E_ILL_CONDITIONED);
    CHECK(roln_ae_init_pod(&ae, 1, samples, 1, NULL, th, area, fresh(ROLN_AE_POD_WORK(OF))) == ROLN_E_ILL_CONDITIONED);
    CHECK(same(of.ae_size, th, before));
    fresh_done();
}

/* A coordinate is too narrow by the widest, wherever that stands: the second of three here. */
static void test_narrow(void)
{
    static const roln_ae shape = {.layers = 1, .size = {3, 3}, .slope = 1, BENT(3, 2)};
    const roln_real V[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1}, mean[3] = {0, 0, 0}, narrow = 64 * ROLN_EPS;
    roln_real x[6] = {-1, 0, 0, 1, 8, 0}, x1[3], range[6];
    x[5] = narrow * 4; /* of 8 there are 64 eps, of 2 there are more */
    CHECK(rolni_pod_range(&shape, 2, x, 1, NULL, V, mean, x1, range) == ROLN_E_ILL_CONDITIONED);
    x[5] = narrow * 16;
    CHECK_OK(rolni_pod_range(&shape, 2, x, 1, NULL, V, mean, x1, range));
    CHECK(memcmp(range, x, sizeof range) == 0); /* lows, highs: the two samples */
}

/* ---- stored small ------------------------------------------------------------------------------- */

#ifndef ROLN_DOUBLE
/* Distance of the decoded states of a stored chart from those of the full one, in parts of their size. */
static ld stored_off(const roln_ae *small, const float *st, const float *th, uint64_t *s)
{
    static float z[200 * 11], x[200 * 24], y[200 * 24];
    states(200, s, z);
    decode(th, 200, z, x);
    roln_ae_decode(small, 1, 200, st, z, y, spare);
    {
        ld sum = 0, all = 0;
        int i;
        for (i = 0; i < 200 * of.N; i++) {
            sum += ((ld)y[i] - (ld)x[i]) * ((ld)y[i] - (ld)x[i]);
            all += (ld)x[i] * (ld)x[i];
        }
        return sqrtl(sum / all);
    }
}

/* Stored in three steps a chart is better than with its rows rounded one by one, and W along Phi does not matter. */
static void check_stored(const roln_ae *shape, const roln_storage *storage, ld most, uint64_t *s)
{
    const int N = shape->size[0], n = shape->size[1];
    float lo[11], hi[11];
    roln_ae small = *shape;
    const int row = ROLN_AE_ROW(storage->bits, N);
    float *th, *st, *plain, *work;
    ld off, off_plain;
    int i, j;
    take(shape);
    small.storage = storage;
    th = weights_of(1, s), st = fresh(roln_ae_params(&small));
    of.ae_size = roln_ae_params(&small), work = fresh(ROLN_AE_QUANTISE_WORK(OF)), of.ae_size = roln_ae_params(&ae);
    for (i = 0; i < n; i++) lo[i] = -1, hi[i] = 1;
    for (i = 0; i < of.monomials; i++) /* W along Phi, three times as large as W */
        for (j = 0; j < N; j++) th[(2 * n + 1 + i) * N + j] += th[i % n * N + j];
    CHECK_OK(roln_ae_quantise(&small, th, lo, hi, st, work));
    off = stored_off(&small, st, th, s);
    plain = copy(roln_ae_params(&small), st);
    CHECK_OK(rolni_quantise_matrix(storage->bits, n, N, th, plain));
    memcpy(plain + rolni_ae_layers(&small) - N, th + 2 * n * N, (size_t)N * sizeof *th);
    CHECK_OK(rolni_quantise_matrix(storage->bits, of.monomials, N, th + (2 * n + 1) * N, plain + rolni_ae_layers(&small)));
    CHECK_OK(rolni_quantise_encoder(storage, N, n, th + n * N, plain, work));
    off_plain = stored_off(&small, plain, th, s);
    CHECK(row < N);
    for (i = 0; i < n * N; i++) plain[i] = 0x1p-20f * th[n * N + i]; /* an encoder whose inverse is beyond half floats */
    if (storage->bits == 16) CHECK(rolni_quantise_encoder(storage, N, n, copy(n * N, plain), st, work) == ROLN_E_RANGE);
    plain[0] = th[of.ae_size - 1], th[of.ae_size - 1] = NAN;
    CHECK(roln_ae_quantise(&small, th, lo, hi, plain, work) == ROLN_E_NOT_FINITE);
    th[of.ae_size - 1] = plain[0];
    BOUND(storage->bits == 8 ? "stored chart, int8" : "stored chart, half", off, most);
    CHECK_BELOW(1.4L * off, off_plain);
    fresh_done();
}
#endif

void TEST_NAME(chart)(void)
{
    static const roln_ae shapes[7] = {
        {.layers = 1, .size = {3, 1}, .slope = 1, BENT(1, 8)},
        {.layers = 1, .size = {6, 2}, .slope = 1, BENT(2, 5)},
        {.layers = 1, .size = {7, 3}, .slope = 1, BENT(3, 3)},
        {.layers = 1, .size = {8, 4}, .slope = 1, BENT(4, 2)},
        {.layers = 2, .size = {7, 5, 2}, .slope = 1, BENT(2, 4)},
        {.layers = 2, .size = {6, 4, 2}, .slope = SLOPE, BENT(2, 3)},
        {.layers = 3, .size = {6, 5, 4, 3}, .slope = SLOPE, BENT(3, 2)},
    };
#ifndef ROLN_DOUBLE
    static const roln_ae stored[2] = { /* parts of 8, and what is left */
        {.layers = 1, .size = {16, 4}, .slope = 1, BENT(4, 4)},
        {.layers = 1, .size = {24, 11}, .slope = 1, BENT(11, 2)},
    };
#endif
    uint64_t seed = 11;
    int n, d, i;
    test_count();
    test_twin();
    for (n = 1; n <= 10; n++)
        for (d = 2; d <= ROLN_DEGREE_MAX; d++)
            for (i = 0; i < 8 && ROLN_MONOMIALS(n, d) <= T_CURVES; i++) check_polynomials(n, d, &seed);
    for (n = 1; n <= 10; n++)
        for (d = 2; d <= ROLN_DEGREE_MAX; d++) check_left_inverse(n, d, 0, &seed), check_left_inverse(n, d, 1, &seed);
    for (i = 0; i < 7; i++) {
        check_recovery(shapes + i, 600, &seed);
        check_portions(shapes + i, 123, &seed);
        check_eight(shapes + i, &seed);
        check_center(shapes + i, &seed);
        check_pod(shapes + i, &seed);
        check_grad(shapes + i, &seed);
        if (shapes[i].layers == 1) check_slow(shapes + i, 200, 0, &seed), check_slow(shapes + i, 200, ROLN_C(0.01), &seed);
    }
    test_ill(&seed);
    test_narrow();
    test_constant_joint(&seed);
    test_failures(&seed);
    test_ridge(&seed);
    test_surface(&seed);
#ifndef ROLN_DOUBLE
    for (i = 0; i < 5; i++) check_stored(stored, &roln_int8, 6e-3L, &seed), check_stored(stored, &roln_half, 3e-4L, &seed);
    check_stored(stored + 1, &roln_int8, 6e-3L, &seed), check_stored(stored + 1, &roln_half, 3e-4L, &seed);
#endif
    print_bounds();
}
