/* SPDX-License-Identifier: MIT */
/* Lagrangian network (roln_lnn.h) against its twin (network.h): terms, inverse dynamics, steps, start and their linearisation, and
   every backward by central differences of the twin.

   Errors of maps and gradients are counted in units of their condition: what moving every input by one eps at random moves
   the result (measured on the library itself), so that a bound does not depend on how the weights were drawn. */
#include <stdlib.h>
#include "roln_lnn.h"
#include "network.h"

void TEST_NAME(lnn)(void);

static const char *const map_name[] = {"zdd", "euler", "rk4", "midpoint", "leapfrog", "inverse", "inverse with w", "start"};

/* ---- perceptron ---- */

static struct {
    roln_mlp f;
    int nb, planes;
    ld th[MAXP], x[3 * MAXB * 8], g[3 * MAXB * 8], t, *dir;
} p;

/* Value, and directional derivatives by the slope of f(x + t d) at 0; nested into the loss. */
static ld p_value(const ld *x, const ld *d, ld t, int out)
{
    ld a[8], y[8];
    int i;
    for (i = 0; i < p.f.size[0]; i++) a[i] = x[i] + t * d[i];
    t_mlp(&p.f, p.th, a, y);
    return y[out];
}

static ld p_plane(int t, int r, int out)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    const int in = p.f.size[0];
    const ld *x = p.x + r * in, *d = p.x + (t * p.nb + r) * in, h = 1e-2L;
    ld s = 0;
    int k;
    if (t == 0) return p_value(x, x, 0, out);
    for (k = 1; k <= 4; k++) s += c[k - 1] * (p_value(x, d, (ld)k * h, out) - p_value(x, d, -(ld)k * h, out));
    return s / h;
}

static ld p_loss(void *ctx)
{
    const int no = p.f.size[p.f.layers];
    ld s = 0;
    int t, r, i;
    (void)ctx;
    for (t = 0; t < p.planes; t++)
        for (r = 0; r < p.nb; r++)
            for (i = 0; i < no; i++) s += p.g[(t * p.nb + r) * no + i] * p_plane(t, r, i);
    return s;
}

/* The value alone and then all directions in one call, or all planes in one call: the same bits, and the same backward. */
static void check_mlp(roln_mlp f, int dirs, int nb, uint64_t *s)
{
    const int in = f.size[0], no = f.size[f.layers], np = roln_mlp_params(&f), h = nb * roln_mlp_hidden(&f), all = 1 + dirs;
    const int wide = roln_mlp_widest(&f, 0) + roln_mlp_widest(&f, 1);
    roln_real *th = fresh(np), *x, *y = fresh(all * nb * no), *y1 = fresh(all * nb * no), *g, *gx, *gth, *gx1, *gth1, *w;
    roln_real *slope = fresh(h), *slope1 = fresh(h), *out = fresh(all * h), *value = fresh(h), *rest = fresh(dirs * h);
    roln_mlp_plane plane[3], apart_plane[3];
    ld ref[3 * MAXB * 8], e;
    int i, r, t;
    roln_mlp_init(&f, 1, th, s);
    for (i = 0; i < np; i++) th[i] += ROLN_C(0.2) * roln_normal(s);
    x = normal(all * nb * in, 0.8, s), g = normal(all * nb * no, 1, s);
    p.f = f, p.nb = nb;
    widen(np, th, p.th), widen(all * nb * in, x, p.x), widen(all * nb * no, g, p.g);
    roln_mlp_forward(&f, 1, all, nb, th, x, y, slope, out);
    roln_mlp_forward(&f, 1, 1, nb, th, x, y1, slope1, value);
    if (dirs) roln_mlp_forward(&f, 0, dirs, nb, th, x + nb * in, y1 + nb * no, slope1, rest);
    CHECK(same(all * nb * no, y, y1) && same(h, slope, slope1));
    CHECK(unused(h, slope) == 0 && unused(all * h, out) == 0 && unused(h, value) == 0 && unused(dirs * h, rest) == 0);
    for (t = 0; t < all; t++) {
        for (r = 0; r < nb; r++)
            for (i = 0; i < no; i++) ref[r * no + i] = p_plane(t, r, i);
        BOUND("perceptron: planes (eps)", distance(nb * no, y + t * nb * no, ref) / EPS, 12);
        plane[t].x = apart_plane[t].x = x + t * nb * in;
        plane[t].out = out, plane[t].planes = all, plane[t].at = t;
        apart_plane[t].out = t ? rest : value, apart_plane[t].planes = t ? dirs : 1, apart_plane[t].at = t ? t - 1 : 0;
    }
    for (p.planes = 1; p.planes <= all; p.planes++) {
        const int more = f.degree > 0 ? 2 * ROLN_MIN(p.planes, 2) * f.size[1] : 0;
        gx = zeros(p.planes * nb * in), gth = zeros(np), w = room_of(ROLN_MLP_BWD_WORK(p.planes, nb, wide) + more);
        roln_mlp_bwd(&f, p.planes, nb, th, plane, slope, g, gx, gth, w);
        CHECK_ROOM();
        e = t_gradient(p.planes * nb * in, gx, p.x, 1e-2L, p_loss, NULL);
        BOUND("perceptron: gradient of x (eps)", e / EPS, 12 + 2 * NOISE);
        e = t_gradient(np, gth, p.th, 1e-2L, p_loss, NULL);
        BOUND("perceptron: gradient of theta (eps)", e / EPS, 12 + 2 * NOISE);
        gx1 = zeros(p.planes * nb * in), gth1 = zeros(np);
        roln_mlp_bwd(&f, p.planes, nb, th, p.planes > 1 ? apart_plane : NULL, slope, g, gx1, NULL, w);
        roln_mlp_bwd(&f, p.planes, nb, th, apart_plane, slope, g, NULL, gth1, w);
        CHECK(same(p.planes * nb * in, gx, gx1) && same(np, gth, gth1));
    }
    fresh_done();
}

/* ---- conditions ---- */

/* Condition: the largest change of an output of the map and of each array of gradients (theta by its parts) when every input
   moves by one eps, up or down: the most of six random moves of 128 eps. */
typedef struct {
    ld out, part[PARTS], g[ARRAYS];
} condition;

static condition condition_of(inputs x, const roln_real *out, inputs g, uint64_t *seed)
{
    const int keep = m.kind != INVERSE_W, nb = m.nb, no = (two_planes() ? 2 : 1) * nb * m.f.n;
    inputs x1 = copy_inputs(x), g1 = zero_inputs();
    roln_real **ax[ARRAYS], **ax1[ARRAYS], **ag[ARRAYS], **ag1[ARRAYS];
    roln_real *out1 = fresh(no), *tape = fresh(tape_of(keep, nb)), *work = fresh(work_of(keep, nb));
    roln_real *back_work = fresh(back_work_of(nb));
    int len[ARRAYS], q, i, j, move;
    condition c;
    memset(&c, 0, sizeof c);
    arrays(&x, ax, len), arrays(&x1, ax1, len), arrays(&g, ag, len), arrays(&g1, ag1, len);
    for (move = 0; move < 6; move++) {
        const ld unit = 128 * EPS;
        for (q = 0; q < ARRAYS; q++)
            for (i = 0; i < len[q]; i++) {
                (*ax1[q])[i] = (*ax[q])[i] * (1 + (roln_normal(seed) > 0 ? 128 : -128) * ROLN_EPS);
                (*ag1[q])[i] = 0;
            }
        for (i = 0; i < len[0]; i++) part_of(i, &j), x1.th[i] = x1.th[i < j ? i : j];
        CHECK(run(&x1, keep, nb, out1, tape, work) == ROLN_OK);
        back(&x1, nb, tape, &g1, back_work);
        c.out = ROLN_MAX(c.out, apart(no, out, out1) / unit);
        for (q = 0; q < ARRAYS; q++) c.g[q] = ROLN_MAX(c.g[q], apart(len[q], *ag[q], *ag1[q]) / unit);
        for (i = 0; i < len[0]; i++) {
            ld *k = c.part + part_of(i, &j);
            *k = ROLN_MAX(*k, fabsl((ld)g.th[i] - (ld)g1.th[i]) * (i == j ? 1 : 2) / unit);
        }
    }
    return c;
}

/* Midpoint and start go through momenta p = M zd and back by M^-1, and form the gradient of a change over h as a difference of
   gradients of momenta: add the condition of these, of lambda^T M zd with lambda = M^-1 y, where lambda has the condition number
   of M, which a move of all inputs does not show since M and M^-1 move together. By the backward of zdd and inverse. */
static void add_momenta(inputs x, condition *c, uint64_t *seed)
{
    const int kind = m.kind, k = m.nb * m.f.n;
    const ld h = kind == START ? m.h : 1;
    roln_real *out = fresh(k), *tape = fresh(TAPE(1, 1, m.nb)), *work = fresh(ROLN_LNN_STEP_BWD_WORK(SZ, ROLN_RK4, m.nb));
    roln_real *zero = zeros(2 * k), *s = x.s;
    ld M[MAXN * MAXN], l[MAXN], top, low, a;
    inputs g;
    condition c1;
    int i, j;
    if (kind != ROLN_MIDPOINT && kind != START) return;
    t_mass(m.s, M);
    t_spectral(LOG, m.f.n, M, M, l);
    for (top = low = l[0], i = 1; i < m.f.n; i++) top = ROLN_MAX(top, l[i]), low = -ROLN_MAX(-low, -l[i]);
    m.kind = ZDD;
    memcpy(zero, s, (size_t)k * sizeof *s);
    x.s = zero, x.a[0] = zeros(k), x.y += k, g = zero_inputs();
    CHECK(run(&x, 1, m.nb, out, tape, work) == ROLN_OK);
    back(&x, m.nb, tape, &g, work);
    for (i = 0; i < k; i++) {
        c->g[1] = ROLN_MAX(c->g[1], top / low * fabsl((ld)x.y[i]) / h);
        x.a[0][i] = kind == START ? (s[k + i] - s[i]) / (roln_real)m.h : s[k + i];
    }
    m.kind = INVERSE;
    x.y = g.a[0], g = zero_inputs();
    CHECK(run(&x, 1, m.nb, out, tape, work) == ROLN_OK);
    back(&x, m.nb, tape, &g, work);
    c1 = condition_of(x, out, g, seed);
    for (i = 0; i < PARTS; i++) c->part[i] += c1.part[i];
    c->g[0] += c1.g[0], c->g[1] += c1.g[1];
    for (i = 0; i < roln_lnn_params(&m.f); i++) {
        ld *most = c->part + part_of(i, &j);
        a = top / low * fabsl((ld)g.th[i]);
        c->g[0] = ROLN_MAX(c->g[0], a), *most = ROLN_MAX(*most, a);
    }
    m.kind = kind;
}

/* got against ref, in units of one eps of ref, what one eps of the inputs moves it, and the rounding of the twin's differences
   of that order (0, 1, 2). The bound: 8 roundings of each input, and a factor of 3 that six random moves may miss. */
static void near_by(const char *what, int n, const roln_real *got, const ld *ref, ld moves, int order)
{
    const ld h = t_width(), noise = order == 0 ? 0 : order == 1 ? 5e-17L / h : 5e-17L / (h * h), bound = 24;
    const ld top = largest(n, ref);
    ld d = 0;
    int i;
    for (i = 0; i < n; i++)
        if (!(fabsl((ld)got[i] - ref[i]) <= d)) d = roln_finite(got[i]) ? fabsl((ld)got[i] - ref[i]) : 1e30L;
    BOUND(what, d / (EPS * (moves + top + 1e-3L) + noise * (top + (order == 1 ? 0.3L : two_planes() ? 1e-3L : 0.03L))), bound);
}

/* a = 2 b to rounding */
static void check_twice(int n, const roln_real *twice, const roln_real *once, ld moves)
{
    ld b[MAXP];
    int i;
    for (i = 0; i < n; i++) b[i] = 2 * (ld)once[i];
    near_by("twice the gradient", n, twice, b, moves, 0);
}

/* Gradient of theta against the twin, part by part, symmetric matrices along symmetric directions. By weights of an input that a
   network does not see it is exactly 0, whatever the slope. */
static void check_theta(const roln_real *g, const condition *c)
{
    static const char *const name[PARTS] = {"gradient of the networks", "gradient of P", "gradient of gyro W",
                                            "gradient of gyro B"};
    static ld slope[MAXP], ref[PARTS][MAXP];
    static roln_real got[PARTS][MAXP];
    const int np = roln_lnn_params(&m.f);
    int k[PARTS] = {0, 0, 0, 0}, unseen = 0, i, j, q;
    t_slopes_params(slope);
    for (i = 0; i < np; i++) {
        q = part_of(i, &j);
        CHECK(same(1, g + i, g + j));
        if (cyclic && m.th[i] == 0) {
            CHECK(g[i] == 0), unseen += slope[i] != 0;
            slope[i] = 0;
        }
        if (j < i) continue;
        ref[q][k[q]] = slope[i], got[q][k[q]++] = g[i] * (i == j ? 1 : 2);
    }
    for (q = 0; q < PARTS; q++)
        if (k[q]) near_by(name[q], k[q], got[q], ref[q], c->part[q], 2);
    CHECK((cyclic != 0) == (unseen > 0));
}

/* ---- maps against the twin ---- */

/* The terms and zdd at one state against the twin. */
static void check_terms(roln_lnn f, uint64_t *seed)
{
    static const char *const name[NTERMS] = {"terms: M", "terms: c", "terms: g", "terms: d", "terms: T", "terms: V"};
    const int n = f.n, nx = n * n + 3 * n + 2, np = roln_lnn_params(&f);
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, ZDD, 1, 0, seed);
    roln_real *X = fresh(nx), *X1 = fresh(nx), *th1 = fresh(np), *s1 = fresh(2 * n);
    roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    roln_real *zdd = fresh(n), *z2 = fresh(n), *c = X + n * n, *g = c + n, *d = g + n;
    ld ref[MAXN * MAXN + 3 * MAXN + 2], Mv[MAXN], move[NTERMS] = {0, 0, 0, 0, 0, 0}, size = 0;
    int at[NTERMS + 1], i, j, q;
    CHECK(TAPE(1, 0, 1) == roln_lnn_tape(&f, 1, 0, 1) && TAPE(2, 0, 3) == roln_lnn_tape(&f, 2, 0, 3));
    CHECK(TAPE(1, 1, 2) == roln_lnn_tape(&f, 1, 1, 2));
    for (i = 0; i <= NTERMS; i++) at[i] = term_at(i);
    CHECK(terms(th, x.s, -1, X, tape, w) == ROLN_OK);
    for (q = 0; q < 6; q++) { /* condition */
        for (i = 0; i < np; i++) {
            part_of(i, &j);
            th1[i] = j < i ? th1[j] : th[i] * (1 + (roln_normal(seed) > 0 ? 128 : -128) * ROLN_EPS);
        }
        for (i = 0; i < 2 * n; i++) s1[i] = x.s[i] * (1 + (roln_normal(seed) > 0 ? 128 : -128) * ROLN_EPS);
        CHECK(terms(th1, s1, -1, X1, tape, w) == ROLN_OK);
        for (i = 0; i < NTERMS; i++)
            move[i] = ROLN_MAX(move[i], apart(at[i + 1] - at[i], X + at[i], X1 + at[i]) / (128 * EPS));
    }
    t_terms(m.s, m.s + n);
    memcpy(ref, tt.M, sizeof *ref * (size_t)(n * n));
    t_apply(tt.C, m.s + n, ref + n * n);
    memcpy(ref + n * n + n, tt.g, sizeof *ref * (size_t)n);
    memcpy(ref + n * n + 2 * n, tt.d, sizeof *ref * (size_t)n);
    t_apply(tt.M, m.s + n, Mv);
    for (ref[at[4]] = 0, i = 0; i < n; i++) ref[at[4]] += Mv[i] * m.s[n + i] / 2;
    ref[at[5]] = tt.V;
    for (i = 0; i < NTERMS; i++) near_by(name[i], at[i + 1] - at[i], X + at[i], ref + at[i], move[i], i == 1 || i == 2);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            const ld unit = EPS * sqrtl((ld)X[i * n + i] * (ld)X[j * n + j]);
            BOUND("terms: M symmetric (eps)", fabsl((ld)X[i * n + j] - (ld)X[j * n + i]) / unit, 4);
        }
    CHECK(roln_lnn_zdd(&f, 0, 1, th, x.s, x.a[0], zdd, tape, w) == ROLN_OK);
    for (i = 0; i < n; i++) { /* M zdd + c + g + d = tau_z, of the library's own terms */
        const ld tau = (ld)x.a[0][i];
        ld e = (ld)c[i] + (ld)g[i] + (ld)d[i] - tau, all = fabsl((ld)c[i]) + fabsl((ld)g[i]) + fabsl((ld)d[i]) + fabsl(tau);
        for (j = 0; j < n; j++) e += (ld)X[i * n + j] * (ld)zdd[j], all += fabsl((ld)X[i * n + j] * (ld)zdd[j]);
        if (fabsl(e) / all > size) size = fabsl(e) / all;
    }
    BOUND("zdd: M zdd + c + g + d = tau_z (eps)", size / EPS, 30);
    for (i = 0; i < n; i++) x.a[0][i] = 0;
    CHECK(roln_lnn_zdd(&f, 0, 1, th, x.s, x.a[0], zdd, tape, w) == ROLN_OK);
    CHECK(roln_lnn_zdd(&f, 0, 1, th, x.s, NULL, z2, tape, w) == ROLN_OK);
    CHECK(same(n, zdd, z2));
    for (q = 0; q < NTERMS; q++) { /* each output may be NULL, and does not change the others */
        CHECK(terms(th, x.s, q, X1, tape, w) == ROLN_OK);
        for (i = 0; i < NTERMS; i++) CHECK(i == q || same(at[i + 1] - at[i], X + at[i], X1 + at[i]));
    }
    fresh_done();
}

/* roln_lnn_zdd_jac reads and writes 2 n^2 numbers of D, n^2 of W, which is M^-1. The sanitizers watch the ends of both. */
static void check_zdd_jac(roln_lnn f, uint64_t *seed)
{
    const int n = f.n, n2 = n * n;
    roln_real *th = weights(&f, seed), *M = fresh(term_at(NTERMS)), *zdd = fresh(n), *tape = fresh(TAPE(1, 1, 1));
    const inputs x = draw(&f, th, ZDD, 1, 0, seed);
    roln_real *work = fresh(ROLN_MAX(ROLN_LNN_ZDD_WORK(SZ, 2, 1), ROLN_MAX(TERMS_WORK, ROLN_LNN_ZDD_JAC_WORK(SZ))));
    roln_real *D = malloc(2 * (size_t)n2 * sizeof *D), *W = malloc((size_t)n2 * sizeof *W);
    int i, j, k;
    CHECK(D && W && terms(th, x.s, -1, M, tape, work) == ROLN_OK); /* M comes first */
    CHECK(roln_lnn_zdd(&f, 2, 1, th, x.s, x.a[0], zdd, tape, work) == ROLN_OK);
    roln_lnn_zdd_jac(&f, th, D, W, tape, work);
    CHECK(roln_all_finite(2 * n2, D));
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            ld e = i == j ? -1 : 0, all = 1;
            for (k = 0; k < n; k++)
                e += (ld)M[i * n + k] * (ld)W[k * n + j], all += fabsl((ld)M[i * n + k] * (ld)W[k * n + j]);
            BOUND("zdd_jac: M W = I (eps)", fabsl(e) / (all * EPS), 30);
        }
    free(D), free(W);
    fresh_done();
}

/* rolni_exp_directions: R U_j R^T by the definition, of n directions and of one more. The sanitizers watch the ends of all. */
static void check_directions(int n, uint64_t *seed)
{
    const int nn = n * n, tri = ROLN_TRI(n), sizes[5] = {nn, n * tri, tri, (n + 1) * nn, (n + 1) * nn};
    roln_real *x[5], U[MAXN * MAXN]; /* R, u, v, F, work */
    int i, j, k, a, b;
    for (i = 0; i < 5; i++) {
        x[i] = malloc((size_t)sizes[i] * sizeof **x);
        if (!CHECK(x[i] != NULL)) return;
        for (k = 0; k < sizes[i]; k++) x[i][k] = roln_normal(seed);
    }
    rolni_exp_directions(n, n + 1, x[0], x[1], x[2], x[3], x[4]);
    for (j = 0; j <= n; j++) {
        rolni_sym(n, j < n ? x[1] + j * tri : x[2], U);
        for (i = 0; i < n; i++)
            for (k = 0; k < n; k++) {
                ld sum = 0, all = 0;
                for (a = 0; a < n; a++)
                    for (b = 0; b < n; b++) {
                        const ld part = (ld)x[0][i * n + a] * (ld)U[a * n + b] * (ld)x[0][k * n + b];
                        sum += part, all += fabsl(part);
                    }
                BOUND("directions: R U R^T (eps)", fabsl((ld)x[3][j * nn + i * n + k] - sum) / (all * EPS), 10);
            }
    }
    for (i = 0; i < 5; i++) free(x[i]);
}

#ifdef ROLN_DOUBLE
static struct {
    inputs x;
    roln_real *out, *tape, *work;
} slope;
static double s_loss(void *ctx)
{
    const int np = roln_lnn_params(&m.f);
    double e = 0;
    int i, j;
    (void)ctx;
    for (i = 0; i < np; i++) part_of(i, &j), slope.x.th[i] = slope.x.th[i > j ? i : j]; /* the lower triangle counts */
    CHECK(run(&slope.x, 1, m.nb, slope.out, slope.tape, slope.work) == ROLN_OK);
    for (i = 0; i < (two_planes() ? 2 : 1) * m.nb * m.f.n; i++) e += slope.x.y[i] * slope.out[i];
    return e;
}

static void check_slope(inputs x, inputs g)
{
    const int np = roln_lnn_params(&m.f), k = m.nb * m.f.n;
    int i, j, q;
    slope.x = x, slope.out = fresh(2 * k), slope.tape = fresh(tape_of(1, m.nb)), slope.work = fresh(work_of(1, m.nb));
    for (i = 0; i < np; i++) part_of(i, &j), g.th[i] *= i < j ? 0 : i > j ? 2 : 1;
    check_halving(np, g.th, x.th, 1e-2, s_loss, NULL);
    check_halving(2 * k, g.s, x.s, m.kind == START ? 1e-3 : 1e-2, s_loss, NULL);
    for (q = 0; q < extras(); q++) check_halving(k, g.a[q], x.a[q], 1e-2, s_loss, NULL);
}
#endif

/* The same bits without the backward, in place, and row by row. */
static void check_forward(const inputs *x, const roln_real *out)
{
    const int n = m.f.n, nb = m.nb, planes = two_planes() ? 2 : 1, no = planes * nb * n;
    roln_real *out1 = fresh(no), *tape = fresh(tape_of(0, nb)), *work = fresh(work_of(0, nb));
    inputs one = copy_inputs(*x);
    int r, q;
    CHECK(run(x, 0, nb, out1, tape, work) == ROLN_OK);
    CHECK(same(no, out, out1) && unused(tape_of(0, nb), tape) == 0);
    if (stepping()) {
        CHECK(run(&one, 0, nb, one.s, tape, work) == ROLN_OK);
        CHECK(same(no, out, one.s));
    }
    for (q = 0; q < extras() && m.kind != ZDD; q++) {
        one = copy_inputs(*x);
        CHECK(run(&one, 0, nb, one.a[q], tape, work) == ROLN_OK);
        CHECK(same(no, out, one.a[q]));
    }
    one = copy_inputs(*x), tape = fresh(tape_of(0, 1)), work = fresh(work_of(0, 1)), out1 = fresh(2 * n);
    for (r = 0; r < nb; r++) {
        row_of(x, r, &one);
        CHECK(run(&one, 0, 1, out1, tape, work) == ROLN_OK);
        CHECK(same(n, out1, out + r * n) && (planes == 1 || same(n, out1 + n, out + (nb + r) * n)));
    }
}

/* The gradients g, each of which may be asked for alone; a step needs that of s. */
static void check_backward(const inputs *x, roln_real *tape, inputs *g)
{
    const int nb = m.nb;
    roln_real **ag[ARRAYS], **at[ARRAYS], *work = fresh(back_work_of(nb));
    inputs alone = zero_inputs();
    int len[ARRAYS], q, j;
    *g = zero_inputs();
    back(x, nb, tape, g, work);
    CHECK(unused(tape_of(1, nb), tape) == 0);
    arrays(g, ag, len), arrays(&alone, at, len);
    for (q = 0; q < 5; q++) {
        inputs only = alone;
        for (j = 0; j < len[q]; j++) (*at[q])[j] = 0;
        for (j = 0; j < len[1]; j++) alone.s[j] = 0;
        only.th = q == 0 ? only.th : NULL, only.s = q == 1 || two_planes() ? only.s : NULL, only.w = q == 4 ? only.w : NULL;
        for (j = 0; j < 2; j++) only.a[j] = q == 2 + j && len[q] ? only.a[j] : NULL;
        back(x, nb, tape, &only, work);
        CHECK(same(len[q], *ag[q], *at[q]));
    }
}

/* A map and its backward, on poisoned memory of exactly the documented sizes. */
static void check_map(roln_lnn f, int kind, int nb, int force, int halving, uint64_t *seed)
{
    static ld ref[2 * MAXB * MAXN];
    roln_real *th = weights(&f, seed), **ag[ARRAYS], **ag2[ARRAYS];
    const inputs x = draw(&f, th, kind, nb, force, seed);
    const int n = f.n, no = (two_planes() ? 2 : 1) * nb * n, keep = kind != INVERSE_W;
    roln_real *out = fresh(no), *tape = fresh(tape_of(keep, nb)), *work = fresh(work_of(keep, nb));
    inputs g = zero_inputs(), g2;
    condition c;
    int len[ARRAYS], q;

    CHECK(run(&x, keep, nb, out, tape, work) == ROLN_OK);
    t_run(ref);
    check_forward(&x, out);
    if (keep) check_backward(&x, tape, &g);
    c = condition_of(x, out, g, seed);
    near_by(map_name[kind], no, out, ref, c.out, 1);
    if (keep) {
        add_momenta(x, &c, seed);
        g2 = copy_inputs(g), arrays(&g, ag, len), arrays(&g2, ag2, len);
        work = fresh(back_work_of(nb));
        back(&x, nb, tape, &g2, work);
        for (q = 0; q < 5; q++) check_twice(len[q], *ag2[q], *ag[q], c.g[q]);
        t_slopes(2 * nb * n, m.s, ref);
        near_by("gradient of the state", 2 * nb * n, g.s, ref, c.g[1], 2);
        if (extras()) {
            t_slopes(nb * n, m.a[0], ref);
            near_by(kind == ZDD ? "gradient of tau_z" : "gradient of zdd", nb * n, g.a[0], ref, c.g[2], 2);
        }
        if (m.force) {
            t_slopes(2 * n, m.w, ref);
            near_by("gradient of the force parameters", 2 * n, g.w, ref, c.g[4], 2);
        }
        check_theta(g.th, &c);
    }
#ifdef ROLN_DOUBLE
    if (halving && keep) check_slope(x, g);
#else
    (void)halving;
#endif
    fresh_done();
}

/* Inverse dynamics: inverse of the forward ones, the full matrix C of Christoffel symbols, linear in w. */
static roln_status inverse(const inputs *x, const roln_real *zdd, const roln_real *w, roln_real *tau, roln_real *tape,
                           roln_real *work)
{
    return roln_lnn_inverse(&m.f, 0, 1, x->th, x->s, w, zdd, tau, tape, work);
}

/* c = C zd, g, d at s [n] each, those not NULL. */
static void forces_at(const roln_real *th, const roln_real *s, roln_real *c, roln_real *g, roln_real *d, roln_real *tape,
                      roln_real *work)
{
    roln_dynamics_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    out.c = c, out.g = g, out.d = d;
    CHECK(roln_lnn_dynamics(&m.f, th, s, &out, tape, work) == ROLN_OK);
}

/* Rounding is measured by these: the terms of C (zd + w) [n][n] and those of the equations [n], by magnitude. */
static void t_sizes(int n, ld *sum, ld *size)
{
    const int nn = n * n;
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (sum[i * n + j] = 0, k = 0; k < n; k++)
                sum[i * n + j] += (fabsl(m.s[n + k]) + fabsl(m.a[1][k])) / 2 *
                                  (fabsl(tt.dM[k * nn + i * n + j]) + fabsl(tt.dM[j * nn + i * n + k]) +
                                   fabsl(tt.dM[i * nn + j * n + k]));
    for (i = 0; i < n; i++) {
        for (size[i] = fabsl(tt.g[i]) + fabsl(tt.d[i]), j = 0; j < n; j++)
            size[i] += sum[i * n + j] * (fabsl(m.s[n + j]) + fabsl(m.a[1][j])) + fabsl(tt.M[i * n + j] * m.a[0][j]);
        size[i] += fabsl(m.a[0][i]);
    }
}

static void check_inverse(roln_lnn f, uint64_t *seed)
{
    const int n = f.n, nn = n * n;
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, INVERSE_W, 1, 0, seed);
    roln_real *tape = fresh(TAPE(2, 0, 1)), *work = fresh(any_work(1));
    roln_real *zdd = fresh(n), *tau = fresh(n), *t2 = fresh(n), *none = zeros(n);
    roln_real *e = zeros(n), *g = fresh(n), *d = fresh(n), *C = fresh(nn), *c = fresh(n), *s = copy(2 * n, x.s);
    roln_real cw[2][MAXN], u[MAXN];
    ld size[MAXN], sum[MAXN * MAXN], v, a, b;
    int i, j, k, q;

    t_terms(m.s, m.s + n);
    t_sizes(n, sum, size);
    CHECK(roln_lnn_zdd(&f, 0, 1, th, x.s, x.a[0], zdd, tape, work) == ROLN_OK); /* inverse(forward) = identity, w = zd */
    CHECK(inverse(&x, zdd, NULL, tau, tape, work) == ROLN_OK);
    CHECK(inverse(&x, zdd, x.s + n, t2, tape, work) == ROLN_OK);
    for (i = 0; i < n; i++) {
        for (v = size[i], j = 0; j < n; j++) v += fabsl(tt.M[i * n + j] * (ld)zdd[j]);
        BOUND("inverse of the forward dynamics (eps)", fabsl((ld)tau[i] - m.a[0][i]) / (EPS * v), 30);
        BOUND("inverse: w = zd (eps)", fabsl((ld)tau[i] - (ld)t2[i]) / (EPS * v), 30);
    }
    forces_at(th, x.s, c, g, d, tape, work); /* C column by column */
    for (k = 0; k < n; k++) {
        e[k] = 1;
        CHECK(inverse(&x, none, e, t2, tape, work) == ROLN_OK);
        for (e[k] = 0, i = 0; i < n; i++) C[i * n + k] = t2[i] - g[i] - d[i];
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            const ld tol = EPS * (sum[i * n + j] + size[i]) + 1e-17L / t_width();
            BOUND("inverse: columns of C (eps)", fabsl((ld)C[i * n + j] - tt.C[i * n + j]) / tol, 30);
        }
    for (q = 0; q < 5; q++) { /* DM[zd] - 2 C is skew */
        for (i = 0; i < n; i++) u[i] = roln_normal(seed);
        for (a = b = 0, i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                const ld x2 = (ld)u[i] * (ld)u[j];
                for (v = 0, k = 0; k < n; k++) v += tt.dM[k * nn + i * n + j] * m.s[n + k];
                a += x2 * (v - 2 * (ld)C[i * n + j]), b += fabsl(x2) * (sum[i * n + j] + fabsl((ld)g[i]) + fabsl((ld)d[i]));
            }
        BOUND("inverse: DM[zd] - 2 C is skew (eps)", fabsl(a) / (EPS * b + 1e-17L / t_width() * (1 + b)), 30);
    }
    CHECK(inverse(&x, none, x.a[1], t2, tape, work) == ROLN_OK); /* polarisation: C w = (c(zd + w) - c(zd - w)) / 4 */
    for (q = 0; q < 2; q++) {
        for (i = 0; i < n; i++) s[n + i] = q ? x.s[n + i] - x.a[1][i] : x.s[n + i] + x.a[1][i];
        forces_at(th, s, cw[q], NULL, NULL, tape, work);
    }
    for (i = 0; i < n; i++) {
        const ld e_i = (ld)t2[i] - (ld)g[i] - (ld)d[i] - ((ld)cw[0][i] - (ld)cw[1][i]) / 4;
        BOUND("inverse: polarisation (eps)", fabsl(e_i) / (EPS * size[i]), 30);
    }
    fresh_done();
}

/* All maps of a variant, and one integrator. Differences of the library move weights of ignorable coordinates away from 0. */
static void check_maps(int i, int scheme, uint64_t *seed)
{
    const int halving = cyclic == 0;
    int k;
    for (k = 0; k < 3; k++) check_terms(variant(i), seed), check_inverse(variant(i), seed);
    check_map(variant(i), ZDD, 1, 0, halving, seed);
    check_map(variant(i), INVERSE, 1, 0, halving, seed);
    check_map(variant(i), INVERSE_W, 1 + (i == 3), 0, halving, seed);
    check_map(variant(i), START, 1, i % 3 == 0, halving, seed);
    check_map(variant(i), scheme, 1 + (i == 0), i % 3 == 0, halving, seed);
}

/* ---- linearisation, start ---- */

/* X J X^T - J, relative, with X = A in canonical variables: dp = M dzd + N dz, N_ik = d(M zd)_i/dz_k, so
   [dz; dp] = [I 0; N M] [dz; dzd] at s and at sn. */
static ld symplectic_defect(const roln_real *A, const ld *s, const ld *sn)
{
    const int n = m.f.n, n2 = 2 * n;
    ld G[2][4 * MAXN * MAXN], D[4 * MAXN * MAXN], B[4 * MAXN * MAXN], worst = 0, top = 0, e;
    int q, i, j, k;
    for (q = 0; q < 2; q++) {
        const ld *x = q ? sn : s;
        t_terms(x, x + n);
        memset(G[q], 0, sizeof G[q]);
        for (i = 0; i < n; i++)
            for (G[q][i * n2 + i] = 1, k = 0; k < n; k++) {
                for (j = 0; j < n; j++) G[q][(n + i) * n2 + k] += tt.dM[k * n * n + i * n + j] * x[n + j];
                G[q][(n + i) * n2 + n + k] = tt.M[i * n + k];
            }
    }
    widen(n2 * n2, A, D);
    t_mul(n2, G[1], D, D); /* G1 A G0^-1 by transposing: G0^T X^T = (G1 A)^T */
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) B[i * n2 + j] = D[j * n2 + i];
    for (i = 0; i < n2; i++)
        for (j = i + 1; j < n2; j++) e = G[0][i * n2 + j], G[0][i * n2 + j] = G[0][j * n2 + i], G[0][j * n2 + i] = e;
    t_solve(n2, n2, G[0], B); /* B = X^T; row i of B is column i of X */
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) {
            for (e = -(j == i + n) + (i == j + n), k = 0; k < n; k++) {
                e += B[i * n2 + k] * B[j * n2 + n + k] - B[i * n2 + n + k] * B[j * n2 + k];
                top = ROLN_MAX(top, fabsl(B[i * n2 + k] * B[j * n2 + n + k]));
            }
            worst = ROLN_MAX(worst, fabsl(e));
        }
    return worst / (top + 1);
}

/* The twin of roln_lnn_step_jac: A = d sn / d s [2n][2n] and, with gw, B = d sn / d w [2n][2n], a row at a time by the backward of
   a step. */
static void linearise(const roln_lnn *f, const roln_system *sys, const inputs *x, roln_real **gw, roln_real *sn, roln_real *A,
                      roln_real *B)
{
    const int n2 = 2 * f->n;
    const roln_real h = (roln_real)m.h;
    roln_real *tape = fresh(tape_of(1, 1)), *work = fresh(work_of(1, 1)), *back_work = fresh(back_work_of(1)), *e = zeros(n2);
    int i;
    CHECK(roln_lnn_step(f, sys, m.kind, 1, 1, h, x->s, sn, tape, work) == ROLN_OK);
    memset(A, 0, (size_t)(n2 * n2) * sizeof *A), memset(B, 0, (size_t)(n2 * n2) * sizeof *B);
    for (i = 0; i < n2; i++) {
        e[i] = 1, *gw = B + i * n2;
        roln_lnn_step_bwd(f, sys, m.kind, 1, h, e, A + i * n2, NULL, tape, back_work);
        e[i] = 0;
    }
}

/* Sizes of roln_lnn_step_jac with `size` numbers that make the force. */
static int jac_tape(void)
{
    return ROLN_JAC_TAPES(m.kind) * TAPE(1, 1, 1);
}

static int jac_work(int size)
{
    sz.step_1 = ROLN_LNN_STEP_WORK(SZ, m.kind, 1, 1);
    return ROLN_LNN_STEP_JAC_WORK(SZ, m.kind, size);
}

/* A and B of roln_lnn_step_jac, transposed as it gives them, against those of the backward, A and B. */
static void check_jac(const roln_lnn *f, const roln_system *sys, const inputs *x, const roln_real *sn, const roln_real *A,
                      const roln_real *B)
{
    const int n2 = 2 * f->n, all_rows = sys->force ? 2 * n2 : n2;
    const roln_real h = (roln_real)m.h;
    roln_real *J = fresh(all_rows * n2), *J0 = fresh(n2 * n2), *to = fresh(n2), *tape = fresh(jac_tape());
    roln_real *work = fresh(jac_work(all_rows - n2));
    ld off = 0, top = 0;
    int i, j;
    CHECK(roln_lnn_step_jac(f, sys, m.kind, all_rows - n2, h, x->s, to, J, tape, work) == ROLN_OK);
    CHECK(same(n2, to, sn)); /* the bits of roln_lnn_step */
    for (i = 0; i < n2; i++)
        for (j = 0; j < all_rows; j++) {
            const roln_real want = j < n2 ? A[i * n2 + j] : B[i * n2 + j - n2];
            off = ROLN_MAX(off, fabsl((ld)J[j * n2 + i] - (ld)want)), top = ROLN_MAX(top, fabsl((ld)want));
        }
    BOUND("linear: against the backward of a step (eps)", off / (EPS * top), 10);
    memcpy(to, x->s, sizeof *to * (size_t)n2); /* in place, and without the force's part */
    CHECK(roln_lnn_step_jac(f, sys, m.kind, 0, h, to, to, J0, tape, work) == ROLN_OK);
    CHECK(same(n2, to, sn) && same(n2 * n2, J0, J));
    CHECK(roln_lnn_step_jac(f, sys, m.kind, all_rows - n2, h, x->s, to, J, room_of(jac_tape()), work) == ROLN_OK);
    CHECK_ROOM();
    CHECK(roln_lnn_step_jac(f, sys, m.kind, all_rows - n2, h, x->s, to, J, tape, room_of(jac_work(all_rows - n2))) == ROLN_OK);
    CHECK_ROOM();
}

/* Linearisation of all schemes: A and B against the backward and the twin; midpoint without damping, and nothing else, is
   symplectic. */
static void check_linear(roln_lnn f, int force, uint64_t *seed)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    const int n = f.n, n2 = 2 * n;
    int scheme, i, j, k;
    for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) {
        roln_real *th = weights(&f, seed), *A = fresh(n2 * n2), *B = fresh(n2 * n2), *sn = fresh(n2), *J, *tape, *work;
        const inputs x = draw(&f, th, scheme, 1, force, seed);
        ld refA[4 * MAXN * MAXN], refB[4 * MAXN * MAXN], out[2 * MAXN], s[2 * MAXN];
        spring sp;
        roln_force fc;
        const roln_system sys = system_of(&x, NULL, &sp, &fc);
        linearise(&f, &sys, &x, &sp.gw, sn, A, B);
        check_jac(&f, &sys, &x, sn, A, B);
        J = fresh(2 * n2 * n2), tape = fresh(jac_tape()), work = fresh(jac_work(force ? n2 : 0));
        CHECK(roln_lnn_step_jac(&f, &sys, scheme, force ? n2 : 0, (roln_real)m.h, x.s, sn, J, tape, work) == ROLN_OK);
        for (i = 0; i < n2 * n2; i++) { /* from here on it is the one that is tested */
            A[i] = J[i % n2 * n2 + i / n2];
            if (force) B[i] = J[n2 * n2 + i % n2 * n2 + i / n2];
        }
        for (j = 0; j < 2 * n2; j++) { /* column j of A, of B */
            ld *at = j < n2 ? m.s + j : m.w + (j - n2), *ref = j < n2 ? refA + j : refB + (j - n2), x0 = *at;
            for (i = 0; i < n2; i++) ref[i * n2] = 0;
            for (k = -4; k <= 4; k++) {
                if (k == 0) continue;
                *at = x0 + (ld)k * t_width();
                t_run(out);
                for (i = 0; i < n2; i++) ref[i * n2] += (k > 0 ? c[k - 1] : -c[-k - 1]) * out[i] / t_width();
            }
            *at = x0;
        }
        near_by("linear: A", n2 * n2, A, refA, 4 * largest(n2 * n2, refA), 2);
        if (force) {
            near_by("linear: B", n2 * n2, B, refB, 4 * largest(n2 * n2, refB), 2);
        } else {
            t_run(out);
            memcpy(s, m.s, sizeof *s * (size_t)n2);
            if (scheme == ROLN_MIDPOINT && !f.damping && !f.friction) {
                const ld unit = EPS + 1e-17L / t_width();
                BOUND("linear: midpoint is symplectic (eps)", symplectic_defect(A, s, out) / unit, 60);
            } else if (EPS < 1e-10L) {
                CHECK(symplectic_defect(A, s, out) > 100 * EPS);
            }
        }
        fresh_done();
    }
}

/* Ld(a, b) = h L((a + b)/2, (b - a)/h) */
static ld lagrangian(const ld *a, const ld *b)
{
    const int n = m.f.n;
    ld z[MAXN] = {0}, v[MAXN] = {0}, Mv[MAXN], M[MAXN * MAXN], V, L = 0;
    int i;
    for (i = 0; i < n; i++) z[i] = (a[i] + b[i]) / 2, v[i] = (b[i] - a[i]) / m.h;
    t_mass(z, M);
    t_net(&m.f.potential_net, m.th + roln_mlp_params(&m.f.mass_net), z, &V);
    t_apply(M, v, Mv);
    for (i = 0; i < n; i++) L += Mv[i] * v[i] / 2;
    return m.h * (L - V);
}

static struct {
    ld z[3][MAXN];
} path;
static ld t_action(void *ctx)
{
    (void)ctx;
    return lagrangian(path.z[0], path.z[1]) + lagrangian(path.z[1], path.z[2]);
}

/* Positions from roln_lnn_start and midpoint steps make the action stationary: D2 Ld(z0, z1) + D1 Ld(z1, z2) + h/2 (F_01 + F_12)
   = 0 with the forces tau_z - d at the midpoints. Unit: eps z / h, the rounding of a velocity, through M. */
static void check_start(roln_lnn f, int force, uint64_t *seed)
{
    const int n = f.n, steps = 4;
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, START, 1, force, seed);
    roln_real *tape = fresh(TAPE(1, 0, 1)), *work = fresh(any_work(1)), *s = fresh(2 * n), z[6][MAXN];
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(&x, NULL, &sp, &fc);
    int k, i, j, q;
    for (i = 0; i < n && m.h > 0.1L; i++) x.s[n + i] = x.s[i] + (x.s[n + i] - x.s[i]) / 16; /* short, so that it settles */
    if (m.h > 0.1L) m.h /= 16;
    memcpy(z[0], x.s, (size_t)n * sizeof *s), memcpy(z[1], x.s + n, (size_t)n * sizeof *s);
    CHECK(roln_lnn_start(&f, &sys, 0, 1, (roln_real)m.h, z[0], z[1], s, tape, work) == ROLN_OK);
    CHECK(same(n, s, z[1]));
    for (k = 1; k <= steps; k++) {
        CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, (roln_real)m.h, s, s, tape, work) == ROLN_OK);
        memcpy(z[k + 1], s, (size_t)n * sizeof *s);
        for (j = 0; j < 3; j++) widen(n, z[k - 1 + j], path.z[j]);
        for (i = 0; i < n; i++) {
            ld r = t_slope(t_action, NULL, path.z[1] + i, 8e-3L * m.h), size = 0;
            for (q = 0; q < 2; q++) {
                ld zm[MAXN], v[MAXN];
                for (j = 0; j < n; j++) {
                    zm[j] = (path.z[q][j] + path.z[q + 1][j]) / 2;
                    v[j] = (path.z[q + 1][j] - path.z[q][j]) / m.h;
                }
                t_terms(zm, v);
                r += m.h / 2 * (t_tau(zm, NULL, i) - tt.d[i]);
                for (j = 0; j < n; j++) size += fabsl(tt.M[i * n + j]) * (1 + fabsl(path.z[1][j]));
            }
            BOUND("start: discrete Euler-Lagrange (eps / h)", fabsl(r) / (EPS * size / m.h), 8);
        }
    }
    fresh_done();
}

/* ---- special parameters ---- */

/* All eigenvalues equal, in the exponential (U = c I, P = I) and thus in every spectral layer: values and gradients as anywhere
   else. With c = 0 a gyro layer sees X = I and log X = 0. */
static void check_repeated(roln_lnn f, roln_real diagonal, int kind, uint64_t *seed)
{
    const int n = f.n, w = f.n, nm = roln_mlp_params(&f.mass_net), np = roln_lnn_params(&f), tri = ROLN_TRI(w);
    const int last = tri * (f.mass_net.size[f.mass_net.layers - 1] + 1);
    roln_real *th = weights(&f, seed);
    inputs x = draw(&f, th, kind, 1, 0, seed), g = zero_inputs();
    roln_real *out = fresh(2 * n), *tape = fresh(tape_of(1, 1)), *work = fresh(ROLN_MAX(work_of(1, 1), back_work_of(1)));
    ld ref[MAXP];
    condition c;
    int i, j;
    for (i = nm - last; i < nm; i++) th[i] = i >= nm - tri && i < nm - tri + w ? diagonal : 0;
    for (i = 0; f.base && i < w * w; i++) th[base_at + i] = i % (w + 1) == 0;
    for (j = 0; j < f.layers; j++)
        for (i = 0; i < w * w; i++) th[layer_at[j] + tri + i] = i % (w + 1) ? 0 : ROLN_C(1.5);
    widen(np, th, m.th);
    CHECK(run(&x, 1, 1, out, tape, work) == ROLN_OK);
    back(&x, 1, tape, &g, work);
    c = condition_of(x, out, g, seed);
    add_momenta(x, &c, seed);
    t_run(ref);
    near_by("equal eigenvalues: value", (two_planes() ? 2 : 1) * n, out, ref, c.out, 1);
    t_slopes(2 * n, m.s, ref);
    near_by("equal eigenvalues: gradient of the state", 2 * n, g.s, ref, c.g[1], 2);
    check_theta(g.th, &c);
    fresh_done();
}

static void test_repeated(uint64_t *seed)
{
    int n, i;
    for (n = 1; n <= 3; n++) check_repeated(shape(n, 0, 2, 3, 0), ROLN_C(0.7), ZDD, seed);
    for (i = 0; i < 2; i++) {
        const int kind = i ? INVERSE : ZDD;
        check_repeated(shape(2, 1, 2, 2, 0), 0, kind, seed);
        check_repeated(behind(shape(2, 1, 2, 2, 0), 1), 0, kind, seed);
        check_repeated(behind(shape(3, 0, 2, 2, 0), 2), ROLN_C(0.4), kind, seed);
        check_repeated(cholesky(shape(2, 0, 2, 2, 0)), 0, kind, seed);
    }
    check_repeated(behind(shape(2, 1, 2, 2, 0), 3), 0, START, seed);
}

/* Networks four times as steep are those of 4 z, bit for bit; nothing but their first layers moves. */
static void check_steep(const roln_lnn *f, uint64_t *seed)
{
    const int n = f->n, params = roln_lnn_params(f);
    roln_real *th = weights(f, seed), *steep = copy(params, th), *s = normal(2 * n, 0.2, seed), *s4 = copy(2 * n, s);
    roln_real M[2][MAXN * MAXN], d[2][MAXN], T[2], V[2];
    roln_dynamics_out out = {M[0], NULL, NULL, d[0], T, V};
    int i, moved = 0;
    set_sizes(f);
    roln_lnn_steepen(f, 4, steep);
    for (i = 0; i < params; i++) moved += !same(1, th + i, steep + i);
    CHECK(moved == (2 + (f->damping > 0)) * n * f->mass_net.size[1]);
    for (i = 0; i < n; i++) s4[i] *= 4;
    CHECK(roln_lnn_dynamics(f, th, s4, &out, fresh(TAPE(1, 0, 1)), fresh(TERMS_WORK)) == ROLN_OK);
    out.M = M[1], out.d = d[1], out.T = T + 1, out.V = V + 1;
    CHECK(roln_lnn_dynamics(f, steep, s, &out, fresh(TAPE(1, 0, 1)), fresh(TERMS_WORK)) == ROLN_OK);
    CHECK(same(n * n, M[0], M[1]) && same(n, d[0], d[1]) && same(1, T, T + 1) && same(1, V, V + 1));
    fresh_done();
}

/* Polynomials stay. */
static void check_not_steep(const roln_lnn *f, uint64_t *seed)
{
    roln_real *th = weights(f, seed), *before = copy(roln_lnn_params(f), th);
    roln_lnn_steepen(f, 4, th);
    CHECK(same(roln_lnn_params(f), th, before));
    fresh_done();
}

/* Where the mass alone is wanted, by NAME_guard_tick and NAME_inertia, no gradient is computed. */
static void check_wanted(const roln_lnn *f)
{
    uint64_t seed = 1;
    roln_real *th = weights(f, &seed), *s = normal(2 * f->n, 0.2, &seed), *tape = fresh(TAPE(1, 0, 1)), *work = fresh(TERMS_WORK);
    const rolni_tape t = rolni_tape_of(f, 1, 0, 1, tape);
    int wanted, i, made;
    for (wanted = ROLNI_MASS; wanted <= ROLNI_GRADIENT; wanted++) {
        for (i = 0; i < f->n; i++) t.kin[i] = t.g[i] = 7;
        CHECK(rolni_eval(f, 0, 1, th, s, NULL, wanted, tape, work) == ROLN_OK);
        for (made = i = 0; i < f->n; i++) made += (t.kin[i] != 7) + (t.g[i] != 7);
        CHECK(made == (wanted == ROLNI_MASS ? 0 : 2 * f->n));
    }
    fresh_done();
}

/* Ignorable coordinates, numbers and angles, one, some and all of a model. */
static void test_cyclic(uint64_t *seed)
{
    static const struct { int variant; unsigned bits; } of[] = {{3, 1}, {4, 6}, {6, 3}, {7, 1}, {10, 2}, {10, 1},
                                                               {11, 5}, {14, 3}, {20, 2}, {21, 3}, {22, 1}};
    int k;
    for (k = 0; k < 11; k++) {
        const roln_lnn f = variant(of[k].variant);
        cyclic = of[k].bits;
        check_maps(of[k].variant, k % 3 == 0 ? ROLN_EULER : k % 3 == 1 ? ROLN_RK4 : ROLN_MIDPOINT, seed);
        check_start(f, k % 2, seed);
        check_linear(f, k % 2, seed);
    }
    cyclic = 0;
}

void TEST_NAME(lnn)(void)
{
    static const roln_mlp nets[] = {{1, {3, 2}, 0}, {2, {2, 5, 3}, 0}, {3, {3, 4, 6, 2}, 0}, {6, {2, 3, 4, 3, 2, 4, 1}, 0}};
    static const roln_mlp polynomials[] = {{2, {3, 9, 2}, 2}, {2, {2, 14, 3}, 4}};
    uint64_t seed = 21;
    int i, T, n, base;
    for (i = 0; i < 4; i++)
        for (T = 0; T <= 2; T++) check_mlp(nets[i], T, 1 + (i + T) % 3, &seed);
    for (n = 1; n <= 5; n++)
        for (i = 0; i < 6; i++) check_terms(shape(n, i % 2, 2 + i % 3, 7, 5), &seed);
    for (base = 0; base < 2; base++) {
        check_map(shape(1, base, 2, 3, 0), ZDD, 1, 0, 0, &seed);
        check_map(shape(2, base, 3, 4, 3), ZDD, 3, 0, 1, &seed);
        check_map(shape(3, base, 3, 4, 5), ZDD, 1, 0, 0, &seed);
        check_map(shape(3, base, 2, 3, 0), INVERSE, 2, 0, 1, &seed);
        check_map(shape(2, base, 2, 3, 0), INVERSE_W, 3, 0, 1, &seed);
        check_map(shape(2, base, 2, 3, 0), START, 2, base, 1, &seed);
        for (i = ROLN_EULER; i <= ROLN_LEAPFROG; i++) {
            check_map(shape(2, base, 2, 3, 0), i, 1, !base, base, &seed);
            check_map(shape(2, base, 2, 3, 0), i, 2, base, 0, &seed);
        }
    }
    for (i = 0; i < VARIANTS; i++) check_maps(i, i % 2 ? ROLN_MIDPOINT : i % 4 ? ROLN_RK4 : ROLN_EULER, &seed);
    for (n = 1; n <= 5; n++)
        for (base = 0; base < 2; base++) check_inverse(shape(n, base, 2, 4, 0), &seed);
    for (i = -1; i < VARIANTS; i++) {
        const roln_lnn f = i < 0 ? shape(3, 1, 2, 4, 0) : variant(i);
        check_steep(&f, &seed), check_wanted(&f);
        check_start(f, 0, &seed), check_start(f, 1, &seed);
        check_linear(f, i % 2 == 0, &seed);
    }
    test_repeated(&seed);
    for (i = VARIANTS; i < ALL; i++) {
        const roln_lnn f = variant(i);
        if (i >= GROWING) check_wanted(&f), check_not_steep(&f, &seed);
        for (T = ROLN_EULER; T <= ROLN_LEAPFROG; T++) check_maps(i, T, &seed);
        check_start(f, i % 2, &seed);
        check_linear(f, i % 2 == 0, &seed);
    }
    test_cyclic(&seed);
    for (i = 0; i < 2; i++)
        for (T = 0; T <= 2; T++) check_mlp(polynomials[i], T, 1 + (i + T) % 3, &seed);
    for (n = 1; n <= 5; n++)
        for (base = 0; base < 2; base++) check_zdd_jac(shape(n, base, 3, 7, 5), &seed);
    for (n = 1; n <= 5; n++) check_directions(n, &seed);
    print_bounds();
}
