/* Lagrangian network (roln_lnn.h) against a twin in long double written from the definitions: naive perceptron, exp by
   Taylor series, M = P exp(P^-1 U), the full tensor dM/dz and Christoffel symbols, Gaussian elimination, and central
   differences of that twin for every backward. */
#include "../roln_lnn.h"
#include "twin.h"

void TEST_NAME(lnn)(void);

#define MAXN 4
#define MAXB 5
#define MAXP 700
#define NOISE (2e-13L / EPS) /* rounding of the nested differences of the twins: 0 in float, 900 in double */

/* A network and all that its losses read. scheme 0: zdd, else a step of length h. */
static struct {
    roln_lnn f;
    int nb, scheme, force, tau;
    ld h, th[MAXP], s[2 * MAXB * MAXN], tau_z[MAXB * MAXN], y[2 * MAXB * MAXN], w[2 * MAXN];
} m;

/* ---- twins ---- */

static void t_mlp(const roln_mlp *f, const ld *th, const ld *x, ld *y)
{
    ld a[2][64];
    int l, i, j;
    for (i = 0; i < f->size[0]; i++) a[0][i] = x[i];
    for (l = 0; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1], last = l + 1 == f->layers;
        ld *out = last ? y : a[(l + 1) % 2];
        for (j = 0; j < no; j++) {
            ld s = th[ni * no + j];
            for (i = 0; i < ni; i++) s += a[l % 2][i] * (last ? th[j * ni + i] : th[i * no + j]);
            out[j] = last ? s : s > 0 ? s + log1pl(expl(-s)) : log1pl(expl(s));
        }
        th += (ni + 1) * no;
    }
}

static void t_mass(const ld *z, ld *M)
{
    static ld u[ROLN_TRI(MAXN)], U[MAXN * MAXN], P[MAXN * MAXN], E[MAXN * MAXN];
    const int n = m.f.n;
    const ld *p = m.th + roln_mlp_params(&m.f.mass) + roln_mlp_params(&m.f.potential);
    int i, j, k = n;
    t_mlp(&m.f.mass, m.th, z, u);
    for (i = 0; i < n; i++)
        for (U[i * n + i] = u[i], j = 0; j < i; j++) U[i * n + j] = U[j * n + i] = u[k++];
    if (!m.f.base) {
        t_exp(n, U, M);
        return;
    }
    memcpy(P, p, sizeof *P * (size_t)(n * n));
    t_solve(n, n, P, U);
    t_exp(n, U, E);
    t_mul(n, p, E, M);
}

/* dM [k][n][n] = dM/dz_k and g = dV/dz, differences of order 8. */
static void t_tensor(const ld *z, ld *dM, ld *g)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    static ld x[MAXN], M[MAXN * MAXN];
    const int n = m.f.n;
    const ld h = 8e-3L;
    int k, q, i;
    memcpy(x, z, sizeof *x * (size_t)n);
    for (i = 0; i < n * n * n; i++) dM[i] = 0;
    for (k = 0; k < n; k++) {
        for (g[k] = 0, q = -4; q <= 4; q++) {
            const ld d = q ? (q < 0 ? -c[-q - 1] : c[q - 1]) / h : 0;
            ld V;
            if (q == 0) continue;
            x[k] = z[k] + (ld)q * h;
            t_mass(x, M);
            for (i = 0; i < n * n; i++) dM[k * n * n + i] += d * M[i];
            t_mlp(&m.f.potential, m.th + roln_mlp_params(&m.f.mass), x, &V);
            g[k] += d * V;
        }
        x[k] = z[k];
    }
}

/* M, c_i = sum_jk Gamma_ijk zd_j zd_k, kin_i = 1/2 sum_jk dM_jk/dz_i zd_j zd_k, g. */
static void t_terms(const ld *z, const ld *zd, ld *M, ld *c, ld *kin, ld *g)
{
    static ld dM[MAXN * MAXN * MAXN];
    const int n = m.f.n, nn = n * n;
    int i, j, k;
    t_mass(z, M);
    t_tensor(z, dM, g);
    for (i = 0; i < n; i++)
        for (c[i] = kin[i] = 0, j = 0; j < n; j++)
            for (k = 0; k < n; k++) {
                c[i] += (dM[k * nn + i * n + j] + dM[j * nn + i * n + k] - dM[i * nn + j * n + k]) / 2 * zd[j] * zd[k];
                kin[i] += dM[i * nn + j * n + k] / 2 * zd[j] * zd[k];
            }
}

/* A force with 2n parameters: tau_i = w_i z_(i+1)^2 + w_(n+i) z_i */
#define FORCE(n, w, z, i) ((w)[i] * (z)[((i) + 1) % (n)] * (z)[((i) + 1) % (n)] + (w)[(n) + (i)] * (z)[i])

static void t_zdd(const ld *s, const ld *sd, const ld *tau, ld *zdd)
{
    static ld M[MAXN * MAXN], c[MAXN], kin[MAXN], g[MAXN];
    const int n = m.f.n;
    int i;
    t_terms(s, sd, M, c, kin, g);
    for (i = 0; i < n; i++) zdd[i] = (m.force ? FORCE(n, m.w, s, i) : tau ? tau[i] : 0) - c[i] - g[i];
    t_solve(n, 1, M, zdd);
}

/* One step of one sample, [z; zd] of length 2n. */
static void t_step(int scheme, ld h, const ld *s, ld *sn)
{
    static const ld w[4] = {1.0L / 6, 1.0L / 3, 1.0L / 3, 1.0L / 6};
    const int n = m.f.n;
    ld k[2 * MAXN], x[2 * MAXN], out[2 * MAXN], M[MAXN * MAXN], c[MAXN], kin[MAXN], g[MAXN], p[MAXN], pn[MAXN], v[MAXN], zm[MAXN];
    int i, j, it;
    if (scheme != ROLN_MIDPOINT) {
        memcpy(x, s, sizeof *x * (size_t)(2 * n));
        memcpy(out, s, sizeof *x * (size_t)(2 * n));
        for (j = 0; j < (scheme == ROLN_EULER ? 1 : 4); j++) {
            memcpy(k, x + n, sizeof *x * (size_t)n);
            t_zdd(x, x + n, NULL, k + n);
            for (i = 0; i < 2 * n; i++) {
                out[i] += h * (scheme == ROLN_EULER ? 1 : w[j]) * k[i];
                x[i] = s[i] + (j < 2 ? h / 2 : h) * k[i];
            }
        }
        memcpy(sn, out, sizeof *x * (size_t)(2 * n));
        return;
    }
    t_mass(s, M); /* z+ = z + h M(z_m)^-1 p_m, p+ = p + h (kin - g + tau)(z_m, M^-1 p_m), from the middle of z and p */
    for (i = 0; i < n; i++)
        for (p[i] = 0, j = 0; j < n; j++) p[i] += M[i * n + j] * s[n + j];
    memcpy(pn, p, sizeof p);
    memcpy(v, s + n, sizeof *v * (size_t)n);
    for (it = 0; it < 60; it++) {
        ld change = 0;
        for (i = 0; i < n; i++) zm[i] = s[i] + h / 2 * v[i];
        t_mass(zm, M);
        for (i = 0; i < n; i++) k[i] = (p[i] + pn[i]) / 2;
        t_solve(n, 1, M, k);
        for (i = 0; i < n; i++) change += fabsl(k[i] - v[i]), v[i] = k[i];
        t_terms(zm, v, M, c, kin, g);
        for (i = 0; i < n; i++) pn[i] = p[i] + h * (kin[i] - g[i] + (m.force ? FORCE(n, m.w, zm, i) : 0));
        if (change < 1e-17L) break;
    }
    CHECK(it < 60);
    for (i = 0; i < n; i++) sn[i] = s[i] + h * v[i], sn[n + i] = pn[i];
    t_mass(sn, M);
    t_solve(n, 1, M, sn + n);
}

/* zdd [nb][n] or the next state [2][nb][n] of the block of m */
static void t_run(ld *out)
{
    const int n = m.f.n;
    ld a[2 * MAXN], b[2 * MAXN];
    int r, i;
    for (r = 0; r < m.nb; r++) {
        if (m.scheme == 0) {
            t_zdd(m.s + r * n, m.s + (m.nb + r) * n, m.tau ? m.tau_z + r * n : NULL, out + r * n);
            continue;
        }
        for (i = 0; i < n; i++) a[i] = m.s[r * n + i], a[n + i] = m.s[(m.nb + r) * n + i];
        t_step(m.scheme, m.h, a, b);
        for (i = 0; i < n; i++) out[r * n + i] = b[i], out[(m.nb + r) * n + i] = b[n + i];
    }
}

static ld t_loss(void *ctx)
{
    ld out[2 * MAXB * MAXN], s = 0;
    int i;
    (void)ctx;
    t_run(out);
    for (i = 0; i < (m.scheme ? 2 : 1) * m.nb * m.f.n; i++) s += m.y[i] * out[i];
    return s;
}

/* ---- the library ---- */

/* The force for the library, with the gradient of its parameters. */
typedef struct {
    int n;
    const roln_real *w;
    roln_real *gw;
} spring;

static void spring_eval(void *ctx, int nb, const roln_real *z, roln_real *tau)
{
    const spring *f = (const spring *)ctx;
    int i;
    for (i = 0; i < nb * f->n; i++) tau[i] = FORCE(f->n, f->w, z + i / f->n * f->n, i % f->n);
}

static void spring_bwd(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz)
{
    const spring *f = (const spring *)ctx;
    int r, i;
    for (r = 0; r < nb; r++, z += f->n, y += f->n, gz += f->n)
        for (i = 0; i < f->n; i++) {
            const int j = (i + 1) % f->n;
            gz[j] += 2 * f->w[i] * z[j] * y[i];
            gz[i] += f->w[f->n + i] * y[i];
            if (params && f->gw) f->gw[i] += z[j] * z[j] * y[i], f->gw[f->n + i] += z[i] * y[i];
        }
}

static int wide_of(const roln_lnn *f)
{
    int l, w = f->n;
    for (l = 1; l < f->mass.layers; l++) w = f->mass.size[l] > w ? f->mass.size[l] : w;
    return w;
}

static roln_lnn shape(int n, int base, int layers, int h1, int h2)
{
    roln_lnn f;
    int i;
    memset(&f, 0, sizeof f);
    f.n = n, f.base = base, f.width[0] = n;
    f.mass.layers = f.potential.layers = layers;
    for (i = 0; i < layers; i++) f.mass.size[i] = f.potential.size[i] = i == 0 ? n : i % 2 ? h1 : h2;
    f.mass.size[layers] = ROLN_TRI(n), f.potential.size[layers] = 1;
    return f;
}

/* Weights with biases, M well away from P, P random. */
static roln_real *weights(const roln_lnn *f, uint64_t *s)
{
    const int p = roln_lnn_params(f), n = f->n, np = p - f->base * n * n;
    roln_real *th = fresh(p);
    int i, j, k;
    roln_lnn_init(f, th, s);
    for (i = 0; i < np; i++) th[i] = ROLN_C(0.9) * th[i] + ROLN_C(0.15) * roln_normal(s);
    if (f->base) {
        roln_real B[MAXN * MAXN];
        for (i = 0; i < n * n; i++) B[i] = ROLN_C(0.3) * roln_normal(s), CHECK(th[np + i] == (roln_real)(i % (n + 1) == 0));
        for (i = 0; i < n; i++)
            for (j = 0; j <= i; j++) {
                roln_real x = ROLN_C(0.8) * (i == j);
                for (k = 0; k < n; k++) x += B[i * n + k] * B[j * n + k];
                th[np + i * n + j] = th[np + j * n + i] = x;
            }
    }
    m.f = *f;
    widen(p, th, m.th);
    return th;
}

#define TAPE(T, nb) roln_lnn_tape(&m.f, T, nb)
#define WORK(T, nb) ROLN_LNN_WORK(m.f.n, m.f.width[0], m.f.layers, rolni_formed(&m.f), wide_of(&m.f), T, nb)
#define STEP_WORK(T, nb) ROLN_STEP_WORK(m.f.n, m.f.width[0], m.f.layers, rolni_formed(&m.f), wide_of(&m.f), T, nb)

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

static void check_mlp(roln_mlp f, int T, int nb, uint64_t *s)
{
    const int in = f.size[0], no = f.size[f.layers], np = roln_mlp_params(&f), h = roln_mlp_hidden(&f);
    roln_real *th = fresh(np), *x, *y, *g, *gx, *gth, *gx1, *gth1, *w, *tape = fresh(ROLN_MLP_TAPE(T, nb, h));
    ld ref[3 * MAXB * 8];
    int i, r, t, wide = in, l;
    for (l = 1; l < f.layers; l++) wide = f.size[l] > wide ? f.size[l] : wide;
    roln_mlp_init(&f, 1, th, s);
    for (i = 0; i < np; i++) th[i] += ROLN_C(0.2) * roln_normal(s);
    x = normal((1 + T) * nb * in, 0.8, s), y = fresh((1 + T) * nb * no);
    g = normal((1 + T) * nb * no, 1, s);
    p.f = f, p.nb = nb;
    widen(np, th, p.th), widen((1 + T) * nb * in, x, p.x), widen((1 + T) * nb * no, g, p.g);
    for (t = 0; t <= T; t++) {
        roln_mlp_forward(&f, T, t, nb, th, x, y, tape);
        for (r = 0; r < nb; r++)
            for (i = 0; i < no; i++) ref[r * no + i] = p_plane(t, r, i);
        BOUND("perceptron: planes (eps)", distance(nb * no, y + t * nb * no, ref) / EPS, 12);
    }
    CHECK(unused(ROLN_MLP_TAPE(T, nb, h), tape) == 0);
    for (p.planes = 1; p.planes <= 1 + T; p.planes++) {
        gx = zeros(p.planes * nb * in), gth = zeros(np), w = fresh(ROLN_MLP_BWD_WORK(p.planes, nb, wide));
        roln_mlp_bwd(&f, T, p.planes, nb, th, x, tape, g, gx, gth, w);
        BOUND("perceptron: gradient of x (eps)", t_gradient(p.planes * nb * in, gx, p.x, 1e-2L, p_loss, NULL) / EPS, 12 + 2 * NOISE);
        BOUND("perceptron: gradient of theta (eps)", t_gradient(np, gth, p.th, 1e-2L, p_loss, NULL) / EPS, 12 + 2 * NOISE);
        gx1 = zeros(p.planes * nb * in), gth1 = zeros(np);
        roln_mlp_bwd(&f, T, p.planes, nb, th, x, tape, g, gx1, NULL, w);
        roln_mlp_bwd(&f, T, p.planes, nb, th, x, tape, g, NULL, gth1, w);
        CHECK(same(p.planes * nb * in, gx, gx1) && same(np, gth, gth1));
    }
    fresh_done();
}

/* ---- evaluation ---- */

/* a = 2 b to rounding */
static void check_twice(int n, const roln_real *twice, const roln_real *once)
{
    ld b[MAXP];
    int i;
    for (i = 0; i < n; i++) b[i] = 2 * (ld)once[i];
    BOUND("lnn: twice the gradient (eps)", distance(n, twice, b) / EPS, 12);
}

/* Gradient of theta against the twin: networks directly, P along symmetric directions. */
static ld p_move, p_base[MAXN * MAXN];
static int p_i, p_j;
static ld t_loss_P(void *ctx)
{
    const int n = m.f.n;
    ld *P = m.th + roln_lnn_params(&m.f) - n * n;
    P[p_i * n + p_j] = P[p_j * n + p_i] = p_base[p_i * n + p_j] + p_move;
    return t_loss(ctx);
}

static void check_theta(const roln_real *g, ld bound)
{
    const int n = m.f.n, np = roln_lnn_params(&m.f) - m.f.base * n * n;
    ld ref[MAXN * MAXN], sum[MAXN * MAXN];
    roln_real got[MAXN * MAXN];
    int k = 0;
    BOUND("gradient of the networks (eps)", t_gradient(np, g, m.th, 8e-3L, t_loss, NULL) / EPS, bound);
    if (!m.f.base) return;
    memcpy(p_base, m.th + np, sizeof *p_base * (size_t)(n * n));
    for (p_i = 0; p_i < n; p_i++)
        for (p_j = 0; p_j <= p_i; p_j++, k++) {
            CHECK(g[np + p_i * n + p_j] == g[np + p_j * n + p_i]);
            got[k] = g[np + p_i * n + p_j] * (p_i == p_j ? 1 : 2);
            p_move = 0;
            sum[k] = t_slope(t_loss_P, NULL, &p_move, 8e-3L);
            t_loss_P(NULL);
            ref[k] = sum[k];
        }
    BOUND("gradient of P (eps)", distance(k, got, ref) / EPS, bound);
}

/* M, c, g, T, V and zdd at one state against the twin. */
static void check_terms(roln_lnn f, uint64_t *seed)
{
    const int n = f.n;
    roln_real *th = weights(&f, seed), *s = normal(2 * n, 0.8, seed), *M = fresh(n * n), *c = fresh(n), *g = fresh(n), *TV = fresh(2);
    roln_real *tape = fresh(TAPE(1, 1)), *w = fresh(WORK(1, 1)), *tau = normal(n, 1, seed), *zdd = fresh(n), *z2 = fresh(n);
    ld x[2 * MAXN], tM[MAXN * MAXN], tc[MAXN], kin[MAXN], tg[MAXN], V, T = 0, size = 0;
    int i, j;
    widen(2 * n, s, x);
    CHECK(roln_lnn_terms(&f, th, s, M, c, g, NULL, TV, TV + 1, tape, w) == ROLN_OK);
    t_terms(x, x + n, tM, tc, kin, tg);
    t_mlp(&f.potential, m.th + roln_mlp_params(&f.mass), x, &V);
    BOUND("terms: M (eps)", distance(n * n, M, tM) / EPS, 25);
    BOUND("terms: c (eps)", distance(n, c, tc) / EPS, 40 + NOISE / 20);
    BOUND("terms: g (eps)", distance(n, g, tg) / EPS, 20);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) T += tM[i * n + j] * x[n + i] * x[n + j] / 2;
    BOUND("terms: T, V (eps)", (fabsl((ld)TV[0] / T - 1) + distance(1, TV + 1, &V)) / EPS, 60);
    CHECK(roln_lnn_zdd(&f, 1, 1, th, s, tau, zdd, tape, w) == ROLN_OK);
    for (i = 0; i < n; i++) { /* M zdd + c + g = tau_z, of the library's own terms */
        ld e = (ld)c[i] + (ld)g[i] - (ld)tau[i], sz = fabsl((ld)c[i]) + fabsl((ld)g[i]) + fabsl((ld)tau[i]);
        for (j = 0; j < n; j++) e += (ld)M[i * n + j] * (ld)zdd[j], sz += fabsl((ld)M[i * n + j] * (ld)zdd[j]);
        if (fabsl(e) / sz > size) size = fabsl(e) / sz;
    }
    BOUND("zdd: M zdd + c + g = tau_z (eps)", size / EPS, 30);
    for (i = 0; i < n; i++) tau[i] = 0;
    CHECK(roln_lnn_zdd(&f, 1, 1, th, s, tau, zdd, tape, w) == ROLN_OK);
    CHECK(roln_lnn_zdd(&f, 1, 1, th, s, NULL, z2, tape, w) == ROLN_OK);
    CHECK(same(n, zdd, z2));
    for (i = 0; i < 5; i++) { /* each output may be NULL, and does not change the others */
        roln_real *M1 = fresh(n * n), *c1 = fresh(n), *g1 = fresh(n), *e1 = fresh(2);
        CHECK(roln_lnn_terms(&f, th, s, i == 0 ? NULL : M1, i == 1 ? NULL : c1, i == 2 ? NULL : g1, NULL, i == 3 ? NULL : e1, i == 4 ? NULL : e1 + 1, tape, w) == ROLN_OK);
        CHECK((i == 0 || same(n * n, M, M1)) && (i == 1 || same(n, c, c1)) && (i == 2 || same(n, g, g1)) && (i == 3 || TV[0] == e1[0]) && (i == 4 || TV[1] == e1[1]));
    }
    fresh_done();
}

#ifdef ROLN_DOUBLE
static roln_real *s_th, *s_s, *s_tau, *s_y, *s_out, *s_tape, *s_work;
static const roln_force *s_force;
static double s_loss(void *ctx)
{
    double e = 0;
    int i;
    (void)ctx;
    if (m.scheme) CHECK(roln_lnn_step(&m.f, m.scheme, 2, m.nb, s_th, s_force, (double)m.h, s_s, s_out, s_tape, s_work) == ROLN_OK);
    else CHECK(roln_lnn_zdd(&m.f, 2, m.nb, s_th, s_s, s_tau, s_out, s_tape, s_work) == ROLN_OK);
    for (i = 0; i < (m.scheme ? 2 : 1) * m.nb * m.f.n; i++) e += s_y[i] * s_out[i];
    return e;
}
#endif

/* Forward and backward of zdd (scheme 0) or of a step, on poisoned memory of exactly the documented sizes. */
static void check_dynamics(roln_lnn f, int scheme, int nb, int force, int slope, uint64_t *seed)
{
    static ld ref[2 * MAXB * MAXN];
    const int n = f.n, np = roln_lnn_params(&f), ns = 2 * nb * n, no = (scheme ? 2 : 1) * nb * n;
    const int stages = scheme ? ROLN_STAGES(scheme) : 1;
    const ld slack = scheme ? 4 : 12, gslack = 150;
    roln_real *th = weights(&f, seed), *s = normal(ns, 0.8, seed), *tau = normal(nb * n, 1, seed), *y = normal(no, 1, seed), *w = normal(2 * n, 0.5, seed);
    roln_real *out = fresh(no), *out1 = fresh(no), *tape = fresh(stages * TAPE(2, nb)), *work = fresh(scheme ? STEP_WORK(2, nb) : WORK(2, nb));
    roln_real *gs, *gth, *gtau, *gw, *gs1, *gth1, *gtau1, *gw1, *tape1 = fresh(TAPE(1, nb)), *work1 = fresh(scheme ? STEP_WORK(1, nb) : WORK(1, nb));
    roln_real *one = fresh(2 * n), *one_tape = fresh(TAPE(1, 1)), *one_work = fresh(scheme ? STEP_WORK(1, 1) : WORK(1, 1));
    const roln_real h = ROLN_C(0.05);
    spring sp;
    roln_force fc;
    int r;
    sp.n = n, sp.w = w, sp.gw = NULL;
    fc.eval = spring_eval, fc.bwd = spring_bwd, fc.ctx = &sp;
    m.nb = nb, m.scheme = scheme, m.force = force, m.tau = !force, m.h = (ld)h;
    widen(ns, s, m.s), widen(nb * n, tau, m.tau_z), widen(no, y, m.y), widen(2 * n, w, m.w);
#define RUN(T, rows, si, so, tp, wk) \
    (scheme ? roln_lnn_step(&f, scheme, T, rows, th, force ? &fc : NULL, h, si, so, tp, wk) : roln_lnn_zdd(&f, T, rows, th, si, tau_, so, tp, wk))
    {
        const roln_real *tau_ = tau;
        CHECK(RUN(2, nb, s, out, tape, work) == ROLN_OK);
        t_run(ref);
        BOUND(scheme == 0 ? "zdd (eps)" : scheme == ROLN_EULER ? "euler (eps)" : scheme == ROLN_RK4 ? "rk4 (eps)" : "midpoint (eps)", distance(no, out, ref) / EPS, slack);
        CHECK(RUN(1, nb, s, out1, tape1, work1) == ROLN_OK); /* same bits without backward, in place, one by one */
        CHECK(same(no, out, out1));
        if (scheme) {
            out1 = copy(ns, s);
            CHECK(RUN(1, nb, out1, out1, tape1, work1) == ROLN_OK);
            CHECK(same(no, out, out1));
        }
        for (r = 0; r < nb; r++) {
            memcpy(one, s + r * n, (size_t)n * sizeof *s);
            memcpy(one + n, s + (nb + r) * n, (size_t)n * sizeof *s);
            tau_ = tau + r * n;
            CHECK(RUN(1, 1, one, one, one_tape, one_work) == ROLN_OK);
            CHECK(same(n, one, out + r * n) && (!scheme || same(n, one + n, out + (nb + r) * n)));
        }
    }
    gs = zeros(ns), gth = zeros(np), gtau = zeros(nb * n), gw = zeros(2 * n);
    work = fresh(scheme ? STEP_WORK(2, nb) : nb * n + WORK(2, nb));
#define BWD(a, b, c) \
    do { \
        if (scheme) roln_lnn_step_bwd(&f, scheme, nb, th, force ? &fc : NULL, h, tape, y, a, b, work); \
        else roln_lnn_zdd_bwd(&f, nb, th, tape, y, a, c, b, work); \
    } while (0)
    sp.gw = gw;
    BWD(gs, gth, gtau);
    BOUND("gradient of the state (eps)", t_gradient(ns, gs, m.s, 8e-3L, t_loss, NULL) / EPS, gslack + NOISE);
    check_theta(gth, gslack + NOISE);
    if (!scheme) BOUND("gradient of tau_z (eps)", t_gradient(nb * n, gtau, m.tau_z, 8e-3L, t_loss, NULL) / EPS, 10 + NOISE / 20);
    if (force) BOUND("gradient of the force parameters (eps)", t_gradient(2 * n, gw, m.w, 8e-3L, t_loss, NULL) / EPS, gslack + NOISE);
    gs1 = copy(ns, gs), gth1 = copy(np, gth), gtau1 = copy(nb * n, gtau), gw1 = copy(2 * n, gw);
    BWD(gs, gth, gtau);
    check_twice(ns, gs, gs1), check_twice(np, gth, gth1), check_twice(nb * n, gtau, gtau1), check_twice(2 * n, gw, gw1);
    gs = zeros(ns), sp.gw = NULL;
    BWD(gs, NULL, NULL);
    CHECK(same(ns, gs, gs1));
    if (!scheme) {
        gth = zeros(np), gtau = zeros(nb * n);
        BWD(NULL, gth, NULL);
        BWD(NULL, NULL, gtau);
        CHECK(same(np, gth, gth1) && same(nb * n, gtau, gtau1));
    }
#ifdef ROLN_DOUBLE
    if (slope) {
        s_th = th, s_s = s, s_tau = tau, s_y = y, s_out = out, s_force = force ? &fc : NULL;
        s_tape = fresh(stages * TAPE(2, nb)), s_work = fresh(scheme ? STEP_WORK(2, nb) : WORK(2, nb));
        check_halving(np - f.base * n * n, gth1, th, 1e-2, s_loss, NULL);
        check_halving(ns, gs1, s, 1e-2, s_loss, NULL);
    }
#else
    (void)slope;
#endif
    fresh_done();
}

/* ---- properties of the motion ---- */

/* Order of the integrators against the twin's RK4 with many steps. */
static void test_order(uint64_t *seed)
{
#ifdef ROLN_DOUBLE
    static const double order[4] = {0, 1, 4, 2};
    const roln_lnn f = shape(2, 1, 3, 5, 4);
    roln_real *th = weights(&f, seed), *s0 = normal(4, 0.7, seed), *tape = fresh(TAPE(1, 1)), *w = fresh(STEP_WORK(1, 1));
    const double T = 0.8;
    ld ref[4];
    int scheme, q, k, i;
    m.force = m.tau = 0;
    widen(4, s0, ref);
    for (k = 0; k < 200; k++) t_step(ROLN_RK4, (ld)T / 200, ref, ref);
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++) {
        double e[3];
        for (q = 0; q < 3; q++) {
            const int steps = (scheme == ROLN_EULER ? 64 : 8) << q;
            double s[4];
            memcpy(s, s0, sizeof s);
            for (k = 0; k < steps; k++) CHECK(roln_lnn_step(&f, scheme, 1, 1, th, NULL, T / steps, s, s, tape, w) == ROLN_OK);
            for (e[q] = 0, i = 0; i < 4; i++) e[q] += fabs(s[i] - (double)ref[i]);
        }
        CHECK_NEAR(log(e[0] / e[1]) / log(2), order[scheme], 0.15);
        CHECK_NEAR(log(e[1] / e[2]) / log(2), order[scheme], 0.1);
    }
    fresh_done();
#else
    (void)seed;
#endif
}

#ifdef ROLN_DOUBLE
/* The step as a map of x = [z; p] */
static void canonical_step(int scheme, const roln_real *th, double h, const double *x, double *y, roln_real *tape, roln_real *w)
{
    const int n = m.f.n;
    double s[2 * MAXN], M[MAXN * MAXN];
    ld A[MAXN * MAXN], b[MAXN];
    int i, j;
    memcpy(s, x, sizeof *s * (size_t)n), memset(s + n, 0, sizeof *s * (size_t)n);
    CHECK(roln_lnn_terms(&m.f, th, s, M, NULL, NULL, NULL, NULL, NULL, tape, w) == ROLN_OK);
    widen(n * n, M, A), widen(n, x + n, b);
    t_solve(n, 1, A, b);
    for (i = 0; i < n; i++) s[n + i] = (double)b[i];
    CHECK(roln_lnn_step(&m.f, scheme, 1, 1, th, NULL, h, s, s, tape, w) == ROLN_OK);
    CHECK(roln_lnn_terms(&m.f, th, s, M, NULL, NULL, NULL, NULL, NULL, tape, w) == ROLN_OK);
    for (i = 0; i < n; i++)
        for (y[i] = s[i], y[n + i] = 0, j = 0; j < n; j++) y[n + i] += M[i * n + j] * s[n + j];
}
#endif

/* Midpoint keeps dz ^ dp, the others do not. */
static void test_symplectic(uint64_t *seed)
{
#ifdef ROLN_DOUBLE
    const roln_lnn f = shape(3, 1, 3, 6, 5);
    enum { N = 6 };
    roln_real *th = weights(&f, seed), *x = normal(N, 0.6, seed), *tape = fresh(TAPE(1, 1)), *w = fresh(STEP_WORK(1, 1));
    double D[N][N], y[4][N], e, worst, xi;
    int scheme, i, j, k, q;
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++) {
        for (j = 0; j < N; j++) {
            for (xi = x[j], q = 0; q < 4; q++) {
                x[j] = xi + 1e-3 * (q < 2 ? q - 2 : q - 1);
                canonical_step(scheme, th, 0.2, x, y[q], tape, w);
            }
            x[j] = xi;
            for (i = 0; i < N; i++) D[i][j] = (8 * (y[2][i] - y[1][i]) - (y[3][i] - y[0][i])) / 12e-3;
        }
        for (worst = 0, i = 0; i < N; i++)
            for (j = 0; j < N; j++) {
                for (e = -(j == i + 3) + (i == j + 3), k = 0; k < 3; k++) e += D[k][i] * D[k + 3][j] - D[k + 3][i] * D[k][j];
                worst = fabs(e) > worst ? fabs(e) : worst;
            }
        if (scheme == ROLN_MIDPOINT) BOUND("midpoint: dz ^ dp", (ld)worst, 1e-10L);
        else CHECK(worst > 1e-9);
    }
    fresh_done();
#else
    (void)seed;
#endif
}

/* A bowl: V = sum softplus(3 z_i) + softplus(-3 z_i), one hidden layer; the mass network varies with z. */
static roln_real *bowl(const roln_lnn *f, uint64_t *seed)
{
    const int n = f->n, h = 2 * n, np = roln_mlp_params(&f->mass);
    roln_real *th = weights(f, seed), *W = th + np;
    int i, k;
    for (i = 0; i < roln_mlp_params(&f->potential); i++) W[i] = 0;
    for (i = 0; i < n; i++) W[i * h + i] = 3, W[i * h + n + i] = -3;
    for (k = 0; k < h; k++) W[n * h + h + k] = 1;
    widen(roln_lnn_params(f), th, m.th);
    return th;
}

static double energy(const roln_lnn *f, const roln_real *th, const roln_real *s, roln_real *tape, roln_real *w)
{
    roln_real T = 0, V = 0;
    CHECK(roln_lnn_terms(f, th, s, NULL, NULL, NULL, NULL, &T, &V, tape, w) == ROLN_OK);
    return (double)T + (double)V;
}

static void test_energy(uint64_t *seed)
{
    const roln_lnn f = shape(2, 1, 2, 4, 0);
    roln_real *th = bowl(&f, seed), *s = fresh(4), *tape = fresh(TAPE(1, 1)), *w = fresh(STEP_WORK(1, 1));
    double e0, e, mean[2] = {0, 0}, swing = 0;
    int k;
    s[0] = ROLN_C(0.6), s[1] = ROLN_C(-0.3), s[2] = ROLN_C(0.2), s[3] = ROLN_C(0.5);
    e0 = energy(&f, th, s, tape, w);
    for (k = 0; k < 10000; k++) {
        CHECK(roln_lnn_step(&f, ROLN_MIDPOINT, 1, 1, th, NULL, ROLN_C(0.05), s, s, tape, w) == ROLN_OK);
        e = energy(&f, th, s, tape, w) - e0;
        mean[k / 5000] += e / 5000;
        swing = fabs(e) > swing ? fabs(e) : swing;
    }
    BOUND("midpoint: energy over 10^4 steps", (ld)(swing / e0), 3e-4L);
    BOUND("midpoint: drift of the energy", (ld)(fabs(mean[1] - mean[0]) / e0), sizeof(roln_real) == 8 ? 1e-6L : 2e-5L);
    fresh_done();
}

/* dE/dt = zd . tau along the flow: E after and before a short RK4 step under a constant force. */
static void const_eval(void *ctx, int nb, const roln_real *z, roln_real *tau)
{
    (void)z;
    memcpy(tau, ctx, sizeof *tau * (size_t)(nb * m.f.n));
}

static void test_power(uint64_t *seed)
{
    int rep;
    for (rep = 0; rep < 6; rep++) {
        const roln_lnn f = shape(3, rep % 2, 3, 6, 5);
        roln_real *th = weights(&f, seed), *s = normal(6, 0.7, seed), *tau = normal(3, 1, seed), *a = fresh(6), *tape = fresh(TAPE(1, 1)), *w = fresh(STEP_WORK(1, 1));
        const roln_real h = sizeof(roln_real) == 8 ? ROLN_C(1e-3) : ROLN_C(3e-2);
        double e[2], power = 0;
        roln_force fc;
        int q, i;
        fc.eval = const_eval, fc.bwd = NULL, fc.ctx = tau;
        for (q = 0; q < 2; q++) {
            CHECK(roln_lnn_step(&f, ROLN_RK4, 1, 1, th, &fc, q ? h : -h, s, a, tape, w) == ROLN_OK);
            e[q] = energy(&f, th, a, tape, w);
        }
        for (i = 0; i < 3; i++) power += (double)s[3 + i] * (double)tau[i];
        BOUND("dE/dt = zd . tau", (ld)fabs((e[1] - e[0]) / (2 * (double)h) - power), sizeof(roln_real) == 8 ? 1e-6L : 2e-3L);
        fresh_done();
    }
}

/* ---- status and edges ---- */

/* Every call that can fail, on the same inputs: all must report st and leave what they write alone. */
static void check_fails(const roln_lnn *f, const roln_real *th, const roln_real *s, const roln_real *tau, roln_status st, int terms)
{
    const int n = f->n;
    roln_real *tape = fresh(3 * TAPE(2, 2)), *w = fresh(STEP_WORK(2, 2)), *out = zeros(4 * n), *zero = zeros(n * n + 4 * n), *M = zeros(n * n + 2 * n + 2);
    roln_force fc;
    int scheme;
    fc.eval = const_eval, fc.bwd = NULL, fc.ctx = copy(2 * n, tau);
    CHECK(roln_lnn_zdd(f, 1, 2, th, s, tau, out, tape, w) == st);
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++)
        CHECK(roln_lnn_step(f, scheme, 1, 2, th, &fc, ROLN_C(0.01), s, out, tape, w) == st);
    CHECK(same(4 * n, out, zero));
    if (terms) {
        roln_real s1[2 * MAXN];
        memcpy(s1, s, sizeof *s * (size_t)n), memcpy(s1 + n, s + 2 * n, sizeof *s * (size_t)n);
        CHECK(roln_lnn_terms(f, th, s1, M, M + n * n, M + n * n + n, NULL, M + n * n + 2 * n, M + n * n + 2 * n + 1, tape, w) == st);
        CHECK(same(n * n + 2 * n + 2, M, zero));
    }
}

static void test_status(uint64_t *seed)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    int base, b, i;
    for (base = 0; base < 2; base++) {
        const roln_lnn f = shape(2, base, 2, 3, 0);
        const int np = roln_lnn_params(&f), nm = roln_mlp_params(&f.mass), nq = np - base * 4;
        for (b = 0; b < 3; b++) {
            for (i = 0; i < 8; i++) {
                roln_real *th = weights(&f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed);
                s[i] = bad[b];
                check_fails(&f, th, s, tau, ROLN_E_NOT_FINITE, i % 4 < 2);
                fresh_done();
            }
            for (i = 0; i < 4; i++) {
                roln_real *th = weights(&f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed);
                tau[i] = bad[b];
                check_fails(&f, th, s, tau, ROLN_E_NOT_FINITE, 0);
                fresh_done();
            }
            for (i = 0; i < np; i++) {
                roln_real *th = weights(&f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed);
                if (i == nq - 1) continue; /* the bias of V moves nothing */
                if (b && i < nq && (i < 9 || (i >= nm && i < nm + 9))) continue; /* softplus' of -Inf is 0: may stay finite */
                th[i] = bad[b];
                if (base && i == nq + 1) continue; /* the upper triangle of P is not read */
                check_fails(&f, th, s, tau, i < nq ? ROLN_E_NOT_FINITE : ROLN_E_NOT_SPD, 1);
                fresh_done();
            }
        }
        {
            roln_real *th = weights(&f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed);
            th[nm - 3] = th[nm - 2] = 120; /* biases of the diagonal of U */
            check_fails(&f, th, s, tau, ROLN_E_RANGE, 1);
            th[nm - 3] = -th[nm - 3], th[nm - 2] = 0;
            check_fails(&f, th, s, tau, ROLN_E_RANGE, 1);
            th[nm - 3] = 0;
            if (base) {
                th[nq] = -1;
                check_fails(&f, th, s, tau, ROLN_E_NOT_SPD, 1);
                th[nq] = 1;
            }
            {
                roln_real out[8], zero[8], *tape = fresh(TAPE(1, 2)), *w = fresh(STEP_WORK(1, 2));
                memset(zero, 0, sizeof zero), memset(out, 0, sizeof out);
                for (i = 4; i < 8; i++) s[i] *= 30;
                CHECK(roln_lnn_step(&f, ROLN_MIDPOINT, 1, 2, th, NULL, 1, s, out, tape, w) != ROLN_OK);
                CHECK(same(8, out, zero));
                for (i = 4; i < 8; i++) s[i] /= 30;
                CHECK(roln_lnn_step(&f, ROLN_EULER, 1, 2, th, NULL, (roln_real)NAN, s, out, tape, w) == ROLN_E_NOT_FINITE);
                CHECK(roln_lnn_step(&f, ROLN_RK4, 1, 2, th, NULL, (roln_real)INFINITY, s, out, tape, w) != ROLN_OK);
                CHECK(same(8, out, zero));
            }
            fresh_done();
        }
    }
}

/* U a multiple of I, all eigenvalues equal: values and gradients as anywhere else. */
static void test_repeated(uint64_t *seed)
{
    int n, i;
    for (n = 1; n <= 3; n++) {
        const roln_lnn f = shape(n, 0, 2, 4, 0);
        const int nm = roln_mlp_params(&f.mass), tri = ROLN_TRI(n), np = roln_lnn_params(&f);
        roln_real *th = weights(&f, seed), *s = normal(2 * n, 0.8, seed), *tau = normal(n, 1, seed), *y = normal(n, 1, seed), *zdd = fresh(n);
        roln_real *tape = fresh(TAPE(2, 1)), *w = fresh(n + WORK(2, 1)), *gs = zeros(2 * n), *gth = zeros(np);
        ld ref[MAXN];
        for (i = nm - tri * 5; i < nm; i++) th[i] = i >= nm - tri && i < nm - tri + n ? ROLN_C(0.7) : 0;
        widen(np, th, m.th), widen(2 * n, s, m.s), widen(n, tau, m.tau_z), widen(n, y, m.y);
        m.nb = 1, m.scheme = 0, m.force = 0, m.tau = 1;
        CHECK(roln_lnn_zdd(&f, 2, 1, th, s, tau, zdd, tape, w) == ROLN_OK);
        t_run(ref);
        BOUND("equal eigenvalues: zdd (eps)", distance(n, zdd, ref) / EPS, 4);
        roln_lnn_zdd_bwd(&f, 1, th, tape, y, gs, NULL, gth, w);
        BOUND("equal eigenvalues: gradient of theta (eps)", t_gradient(np, gth, m.th, 8e-3L, t_loss, NULL) / EPS, 5 + NOISE);
        BOUND("equal eigenvalues: gradient of s (eps)", t_gradient(2 * n, gs, m.s, 8e-3L, t_loss, NULL) / EPS, 5 + NOISE);
        fresh_done();
    }
}

void TEST_NAME(lnn)(void)
{
    static const roln_mlp nets[] = {{1, {3, 2}}, {2, {2, 5, 3}}, {3, {3, 4, 6, 2}}, {6, {2, 3, 4, 3, 2, 4, 1}}};
    uint64_t seed = 21;
    int i, T, n, base;
    for (i = 0; i < 4; i++)
        for (T = 0; T <= 2; T++) check_mlp(nets[i], T, 1 + (i + T) % 3, &seed);
    for (n = 1; n <= 4; n++)
        for (i = 0; i < 6; i++) check_terms(shape(n, i % 2, 2 + i % 3, 7, 5), &seed);
    for (base = 0; base < 2; base++) {
        check_dynamics(shape(1, base, 2, 3, 0), 0, 1, 0, 0, &seed);
        check_dynamics(shape(2, base, 3, 4, 3), 0, 3, 0, 1, &seed);
        check_dynamics(shape(3, base, 3, 4, 5), 0, 1, 0, 0, &seed);
        for (i = ROLN_EULER; i <= ROLN_MIDPOINT; i++) {
            check_dynamics(shape(2, base, 2, 3, 0), i, 1, !base, base, &seed);
            check_dynamics(shape(2, base, 2, 3, 0), i, 2, base, 0, &seed);
        }
    }
    test_order(&seed);
    test_symplectic(&seed);
    test_energy(&seed);
    test_power(&seed);
    test_status(&seed);
    test_repeated(&seed);
    print_bounds();
}
