/* SPDX-License-Identifier: MIT */
/* Lagrangian network (roln_lnn.h) against a twin in long double written from the definitions: naive perceptron, exp by
   Taylor series, M = P exp(P^-1 U), SPD layers by Jacobi, the full tensor dM/dz and Christoffel symbols, Gaussian elimination,
   and central differences of that twin for every backward.

   Errors of maps and gradients are counted in units of their condition: what moving every input by one eps at random moves
   the result (measured on the library itself), so that a bound does not depend on how the weights were drawn. */
#include "roln_lnn.h"
#include "twin.h"
#include "room.h"

void TEST_NAME(lnn)(void);

#define MAXN 5
#define MAXB 5
#define MAXP 1600
#define NOISE (2e-13L / EPS) /* rounding of the nested differences of the twins: 0 in float, 900 in double */

/* The maps under test: the forward dynamics, the integrators by their own names, and */
enum { ZDD = 0, INVERSE = 4, INVERSE_W = 5, START = 6 };
static const char *const map_name[] = {"zdd", "euler", "rk4", "midpoint", "inverse", "inverse with w", "start"};

/* A network, and all that a map of it reads: the state s (start: z0, z1), a[0] (tau_z or zdd), a[1] (w), the force w, and the
   weights y of its outputs in a loss. */
static struct {
    roln_lnn f;
    int nb, kind, force;
    ld h, th[MAXP], s[2 * MAXB * MAXN], a[2][MAXB * MAXN], y[2 * MAXB * MAXN], w[2 * MAXN];
} m;

/* The sizes of a shape for the macros: SZ(n), SZ(base) .. */
static struct {
    int n, base, damping, cossin, cholesky, formed, hidden, wide, layers;
    int row_mass, row_gradient, row_dm, row_bwd_0, row_bwd_1, row_bwd_2, row_jac_1, row_jac_2;
} sz;
#define SZ(x) sz.x

static void set_sizes(const roln_lnn *f)
{
    const roln_mlp *net = &f->mass_net;
    int i, even = 0, odd = 0;
    memset(&sz, 0, sizeof sz);
    sz.n = f->n, sz.base = f->base, sz.damping = f->damping;
    sz.cossin = f->angles ? net->size[0] : 0;
    sz.cholesky = f->mass == ROLN_CHOLESKY, sz.layers = f->layers, sz.formed = sz.cholesky || f->layers > 0;
    for (i = 0; i < net->layers; i++) {
        if (i % 2) odd = ROLN_MAX(odd, net->size[i]);
        else even = ROLN_MAX(even, net->size[i]);
        if (i > 0) sz.hidden += net->size[i];
    }
    sz.wide = even + odd;
#define SET(name, size) sz.name = (size);
    ROLN_LNN_ROWS(SET, SZ)
#undef SET
}

#define TAPE(dirs, keep, nb) ROLN_LNN_TAPE(SZ, dirs, keep, nb)
#define TERMS_WORK ROLN_LNN_TERMS_WORK(SZ)

/* Where the parts of theta begin, in the order that the header tells. */
static int damper_at, friction_at, base_at, layer_at[ROLN_LAYERS_MAX];

static void layout(const roln_lnn *f)
{
    const int n = f->n;
    int i, at;
    damper_at = roln_mlp_params(&f->mass_net) + roln_mlp_params(&f->potential_net);
    friction_at = damper_at + (f->damping ? roln_mlp_params(&f->damper_net) : 0);
    base_at = at = friction_at + (f->friction ? 2 * f->n : 0);
    if (f->base) at += n * n;
    for (i = 0; i < f->layers; i++, at += ROLN_TRI(n) + n * n) layer_at[i] = at;
    CHECK(at == roln_lnn_params(f));
    set_sizes(f);
}

/* The part of theta that number i belongs to; for the entry of a symmetric matrix *mirror is its transpose, else i. */
enum { NETWORKS, BASE, GYRO_W, GYRO_B, PARTS };
static int part_of(int i, int *mirror)
{
    const int w = m.f.n;
    int k, b;
    *mirror = i;
    if (i < base_at) return NETWORKS;
    if (m.f.base && i < base_at + w * w) {
        *mirror = base_at + (i - base_at) % w * w + (i - base_at) / w;
        return BASE;
    }
    for (k = m.f.layers - 1; i < layer_at[k];) k--;
    b = layer_at[k] + ROLN_TRI(w);
    if (i < b) return GYRO_W;
    *mirror = b + (i - b) % w * w + (i - b) / w;
    return GYRO_B;
}

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

/* A network of f at z: of cos and sin of the angles. */
static void t_net(const roln_mlp *net, const ld *th, const ld *z, ld *y)
{
    ld x[2 * MAXN];
    int i, k = m.f.n;
    for (i = 0; i < m.f.n; i++) {
        const int angle = (int)(m.f.angles >> i) & 1;
        x[i] = angle ? cosl(z[i]) : z[i];
        if (angle) x[k++] = sinl(z[i]);
    }
    t_mlp(net, th, x, y);
}

static void t_low(int n, const ld *u, int symmetric, ld *U)
{
    int i, j, k = n;
    for (i = 0; i < n * n; i++) U[i] = 0;
    for (i = 0; i < n; i++)
        for (U[i * n + i] = u[i], j = 0; j < i; j++) {
            U[i * n + j] = u[k++];
            if (symmetric) U[j * n + i] = U[i * n + j];
        }
}

/* Y = A B C^T with A, C [m][n]. */
static void t_congr(int mm, int n, const ld *A, const ld *B, const ld *C, ld *Y)
{
    ld t[MAXN * MAXN];
    int i, j, k;
    for (i = 0; i < mm; i++)
        for (j = 0; j < n; j++)
            for (t[i * n + j] = 0, k = 0; k < n; k++) t[i * n + j] += A[i * n + k] * B[k * n + j];
    for (i = 0; i < mm; i++)
        for (j = 0; j < mm; j++)
            for (Y[i * mm + j] = 0, k = 0; k < n; k++) Y[i * mm + j] += t[i * n + k] * C[j * n + k];
}

/* Y = f(X) on the eigenvalues, which go to l. */
enum { SQRT, LOG };
static void t_spectral(int kind, int n, const ld *X, ld *Y, ld *l)
{
    ld A[MAXN * MAXN], V[MAXN * MAXN], D[MAXN * MAXN];
    int i;
    for (i = 0; i < n * n; i++) A[i] = (X[i] + X[i % n * n + i / n]) / 2, D[i] = 0;
    t_jacobi(n, A, V);
    for (i = 0; i < n; i++) {
        const ld x = l[i] = A[i * n + i];
        D[i * n + i] = kind == SQRT ? sqrtl(x) : logl(x);
    }
    t_congr(n, n, V, D, V, Y);
}

/* The mass matrix. */
static void t_mass(const ld *z, ld *X)
{
    ld u[ROLN_TRI(MAXN)], U[MAXN * MAXN], W[MAXN * MAXN], E[MAXN * MAXN];
    const roln_lnn *f = &m.f;
    const int w = f->n;
    int i, j;
    t_net(&f->mass_net, m.th, z, u);
    t_low(w, u, f->mass == ROLN_EXPONENTIAL, U);
    if (f->mass == ROLN_CHOLESKY) {
        for (i = 0; i < w * w; i++) W[i] = i % (w + 1) == 0;
        t_congr(w, w, U, W, U, X);
        for (i = 0; i < w; i++) X[i * (w + 1)] += (ld)f->least;
    } else if (!f->base) {
        t_exp(w, U, X);
    } else {
        memcpy(W, m.th + base_at, sizeof *W * (size_t)(w * w));
        t_solve(w, w, W, U);
        t_exp(w, U, E);
        t_mul(w, m.th + base_at, E, X);
    }
    for (i = 0; i < f->layers; i++) { /* A^1/2 B A^1/2, A = exp(W o log X) */
        const ld *th = m.th + layer_at[i];
        t_spectral(LOG, w, X, E, u);
        t_low(w, th, 1, W);
        for (j = 0; j < w * w; j++) U[j] = W[j] * E[j];
        t_exp(w, U, E);
        t_spectral(SQRT, w, E, E, u);
        t_congr(w, w, E, th + ROLN_TRI(w), E, X);
    }
}

/* Step of the differences. Masses with sqrt, log or L L^T are less smooth than exp. */
static ld t_width(void)
{
    return rolni_formed(&m.f) ? 3e-3L : 6e-3L;
}

/* The terms at one state: dM [k][n][n] = dM/dz_k and g = dV/dz by differences of order 8, C_ij = sum_k Gamma_ijk zd_k,
   kin_i = 1/2 sum_jk dM_jk/dz_i zd_j zd_k, d = L L^T zd. */
static struct {
    ld M[MAXN * MAXN], dM[MAXN * MAXN * MAXN], C[MAXN * MAXN], kin[MAXN], g[MAXN], d[MAXN], V;
} tt;

static void t_terms(const ld *z, const ld *zd)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    const ld *pot = m.th + roln_mlp_params(&m.f.mass_net), h = t_width();
    ld x[MAXN], M[MAXN * MAXN], u[ROLN_TRI(MAXN)], L[MAXN * MAXN], V, y;
    const int n = m.f.n, nn = n * n;
    int i, j, k, q;
    memset(&tt, 0, sizeof tt);
    t_mass(z, tt.M);
    t_net(&m.f.potential_net, pot, z, &tt.V);
    memcpy(x, z, sizeof *x * (size_t)n);
    for (k = 0; k < n; k++) {
        for (q = -4; q <= 4; q++) {
            const ld w = q ? (q < 0 ? -c[-q - 1] : c[q - 1]) / h : 0;
            if (q == 0) continue;
            x[k] = z[k] + (ld)q * h;
            t_mass(x, M);
            for (i = 0; i < nn; i++) tt.dM[k * nn + i] += w * M[i];
            t_net(&m.f.potential_net, pot, x, &V);
            tt.g[k] += w * V;
        }
        x[k] = z[k];
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (k = 0; k < n; k++) {
                tt.C[i * n + j] += (tt.dM[k * nn + i * n + j] + tt.dM[j * nn + i * n + k] - tt.dM[i * nn + j * n + k]) / 2 * zd[k];
                tt.kin[i] += tt.dM[i * nn + j * n + k] / 2 * zd[j] * zd[k];
            }
    for (i = 0; m.f.friction && i < n; i++)
        tt.d[i] = expl(m.th[friction_at + i]) * tanhl(zd[i] / expl(m.th[friction_at + n + i]));
    if (!m.f.damping) return;
    t_net(&m.f.damper_net, m.th + damper_at, z, u);
    t_low(n, u, 0, L);
    for (j = 0; j < n; j++) {
        for (y = 0, i = 0; i < n; i++) y += L[i * n + j] * zd[i];
        for (i = 0; i < n; i++) tt.d[i] += L[i * n + j] * y;
    }
}

/* y = A x [n][n] */
static void t_apply(const ld *A, const ld *x, ld *y)
{
    const int n = m.f.n;
    int i, j;
    for (i = 0; i < n; i++)
        for (y[i] = 0, j = 0; j < n; j++) y[i] += A[i * n + j] * x[j];
}

/* A force with 2n parameters: tau_i = w_i z_(i+1)^2 + w_(n+i) z_i */
#define FORCE(n, w, z, i) ((w)[i] * (z)[((i) + 1) % (n)] * (z)[((i) + 1) % (n)] + (w)[(n) + (i)] * (z)[i])

static ld t_tau(const ld *z, const ld *tau, int i)
{
    return m.force ? FORCE(m.f.n, m.w, z, i) : tau ? tau[i] : 0;
}

static void t_zdd(const ld *s, const ld *zd, const ld *tau, ld *zdd)
{
    ld c[MAXN];
    int i;
    t_terms(s, zd);
    t_apply(tt.C, zd, c);
    for (i = 0; i < m.f.n; i++) zdd[i] = t_tau(s, tau, i) - c[i] - tt.g[i] - tt.d[i];
    t_solve(m.f.n, 1, tt.M, zdd);
}

static void t_inverse(const ld *s, const ld *zd, const ld *zdd, const ld *w, ld *tau)
{
    ld c[MAXN];
    int i;
    t_terms(s, zd);
    t_apply(tt.C, w, c);
    t_apply(tt.M, zdd, tau);
    for (i = 0; i < m.f.n; i++) tau[i] += c[i] + tt.g[i] + tt.d[i];
}

/* s1 = [z1; zd1] from z0, z1: zd1 = M(z1)^-1 (M v + h/2 F) */
static void t_start(ld h, const ld *z0, const ld *z1, ld *s1)
{
    const int n = m.f.n;
    ld zm[MAXN], v[MAXN];
    int i;
    for (i = 0; i < n; i++) zm[i] = (z0[i] + z1[i]) / 2, v[i] = (z1[i] - z0[i]) / h;
    t_terms(zm, v);
    t_apply(tt.M, v, s1 + n);
    for (i = 0; i < n; i++) s1[i] = z1[i], s1[n + i] += h / 2 * (tt.kin[i] - tt.g[i] - tt.d[i] + t_tau(zm, NULL, i));
    t_mass(z1, tt.M);
    t_solve(n, 1, tt.M, s1 + n);
}

/* One step of one sample, [z; zd] of length 2n. */
static void t_step(int scheme, ld h, const ld *s, ld *sn)
{
    static const ld w[4] = {1.0L / 6, 1.0L / 3, 1.0L / 3, 1.0L / 6};
    const int n = m.f.n;
    ld k[2 * MAXN], x[2 * MAXN], out[2 * MAXN], p[MAXN], pn[MAXN], v[MAXN], zm[MAXN];
    int i, j, it, settled = 0;
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
    t_mass(s, tt.M); /* z+ = z + h M(z_m)^-1 p_m, p+ = p + h (kin - g - d + tau)(z_m, M^-1 p_m), from the middle of z and p */
    t_apply(tt.M, s + n, p);
    memcpy(pn, p, sizeof p);
    memcpy(v, s + n, sizeof *v * (size_t)n);
    for (it = 0; it < 60; it++) {
        ld change = 0;
        for (i = 0; i < n; i++) zm[i] = s[i] + h / 2 * v[i];
        t_mass(zm, tt.M);
        for (i = 0; i < n; i++) k[i] = (p[i] + pn[i]) / 2;
        t_solve(n, 1, tt.M, k);
        for (i = 0; i < n; i++) change += fabsl(k[i] - v[i]), v[i] = k[i];
        t_terms(zm, v);
        for (i = 0; i < n; i++) pn[i] = p[i] + h * (tt.kin[i] - tt.g[i] - tt.d[i] + t_tau(zm, NULL, i));
        if (change < 1e-11L && ++settled == (EPS > 1e-10L ? 1 : 4)) break;
    }
    CHECK(it < 60);
    for (i = 0; i < n; i++) sn[i] = s[i] + h * v[i], sn[n + i] = pn[i];
    t_mass(sn, tt.M);
    t_solve(n, 1, tt.M, sn + n);
}

/* Maps with two planes of outputs [z; zd] rather than one. */
static int two_planes(void)
{
    return m.kind == START || (m.kind >= ROLN_EULER && m.kind <= ROLN_MIDPOINT);
}

/* The map m.kind of the block of m: [nb][n] or [2][nb][n]. */
static void t_run(ld *out)
{
    const int n = m.f.n;
    ld a[2 * MAXN], b[2 * MAXN];
    int r, i;
    for (r = 0; r < m.nb; r++) {
        const ld *z = m.s + r * n, *zd = m.s + (m.nb + r) * n, *a0 = m.a[0] + r * n, *a1 = m.a[1] + r * n;
        if (m.kind == ZDD) t_zdd(z, zd, a0, out + r * n);
        if (m.kind == INVERSE) t_inverse(z, zd, a0, zd, out + r * n);
        if (m.kind == INVERSE_W) t_inverse(z, zd, a0, a1, out + r * n);
        if (!two_planes()) continue;
        for (i = 0; i < n; i++) a[i] = z[i], a[n + i] = zd[i];
        if (m.kind == START) t_start(m.h, a, a + n, b);
        else t_step(m.kind, m.h, a, b);
        for (i = 0; i < n; i++) out[r * n + i] = b[i], out[(m.nb + r) * n + i] = b[n + i];
    }
}

static ld t_loss(void *ctx)
{
    ld out[2 * MAXB * MAXN], s = 0;
    int i;
    (void)ctx;
    t_run(out);
    for (i = 0; i < (two_planes() ? 2 : 1) * m.nb * m.f.n; i++) s += m.y[i] * out[i];
    return s;
}

/* Slopes of the loss in n inputs; parameters: along symmetric directions. */
static void t_slopes(int n, ld *x, ld *ref)
{
    int i;
    for (i = 0; i < n; i++) ref[i] = t_slope(t_loss, NULL, x + i, t_width());
}

static struct {
    int i, j;
    ld x0, move;
} param;
static ld t_loss_param(void *ctx)
{
    m.th[param.i] = m.th[param.j] = param.x0 + param.move;
    return t_loss(ctx);
}

static void t_slopes_params(ld *ref)
{
    for (param.i = 0; param.i < roln_lnn_params(&m.f); param.i++) {
        part_of(param.i, &param.j);
        if (param.j < param.i) {
            ref[param.i] = ref[param.j];
            continue;
        }
        param.x0 = m.th[param.i], param.move = 0;
        ref[param.i] = t_slope(t_loss_param, NULL, &param.move, t_width());
        m.th[param.i] = m.th[param.j] = param.x0;
    }
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

static void spring_jac(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
{
    const spring *f = (const spring *)ctx;
    const int n = f->n;
    int i;
    memset(H, 0, sizeof *H * (size_t)(n * n));
    if (G) memset(G, 0, sizeof *G * (size_t)(2 * n * n));
    for (i = 0; i < n; i++) {
        const int j = (i + 1) % n;
        H[j * n + i] += 2 * f->w[i] * z[j];
        H[i * n + i] += f->w[n + i];
        if (G) G[i * n + i] = z[j] * z[j], G[(n + i) * n + i] = z[i];
    }
}

static roln_lnn shape(int n, int base, int layers, int h1, int h2)
{
    roln_lnn f;
    int i;
    memset(&f, 0, sizeof f);
    f.n = n, f.base = base;
    f.mass_net.layers = layers;
    for (i = 0; i < layers; i++) f.mass_net.size[i] = i == 0 ? n : i % 2 ? h1 : h2;
    f.potential_net = f.damper_net = f.mass_net;
    f.mass_net.size[layers] = f.damper_net.size[layers] = ROLN_TRI(n), f.potential_net.size[layers] = 1;
    return f;
}

/* SPD layers behind the exponential of f. */
static roln_lnn behind(roln_lnn f, int layers)
{
    f.layers = layers;
    return f;
}

static roln_lnn cholesky(roln_lnn f)
{
    f.mass = ROLN_CHOLESKY, f.least = ROLN_C(0.1);
    return f;
}

static roln_lnn damped(roln_lnn f)
{
    f.damping = 1;
    return f;
}

static roln_lnn rubbing(roln_lnn f)
{
    f.friction = 1;
    return f;
}

/* Angles where `angles` has a bit; the networks have an input more for each. */
static roln_lnn turning(roln_lnn f, uint32_t angles)
{
    int i;
    f.angles = angles;
    for (i = 0; i < f.n; i++) f.mass_net.size[0] += (int)(angles >> i) & 1;
    f.potential_net.size[0] = f.damper_net.size[0] = f.mass_net.size[0];
    return f;
}

/* The shapes that all maps are tested on; small, since the twin differentiates in every parameter. */
enum { VARIANTS = 10, TURNING = 13, ALL = 15 }; /* behind VARIANTS those with angles, behind TURNING with friction, or both */
static roln_lnn variant(int i)
{
    switch (i) {
    case 0: return behind(shape(2, 1, 2, 3, 0), 1);
    case 1: return behind(shape(3, 0, 2, 3, 0), 1);
    case 2: return behind(shape(1, 1, 2, 3, 0), 2);
    case 3: return damped(behind(shape(2, 1, 2, 2, 0), 2));
    case 4: return cholesky(shape(3, 0, 2, 3, 0));
    case 5: return damped(cholesky(shape(2, 0, 3, 2, 3)));
    case 6: return damped(shape(2, 1, 2, 3, 0));
    case 7: return damped(behind(shape(1, 0, 2, 2, 0), 1));
    case 8: return behind(shape(2, 0, 2, 2, 0), 2);
    case 9: return shape(2, 1, 2, 2, 0);
    case 10: return turning(damped(shape(2, 1, 2, 3, 0)), 2);
    case 11: return turning(cholesky(damped(shape(3, 0, 3, 2, 2))), 5);
    case 12: return turning(shape(2, 0, 2, 3, 0), 3);
    case 13: return rubbing(shape(2, 0, 2, 3, 0));
    default: return rubbing(turning(damped(shape(2, 1, 2, 2, 0)), 1));
    }
}

/* A random SPD matrix around I, and its value after roln_lnn_init. */
static void random_spd(int n, roln_real *X, uint64_t *s)
{
    roln_real B[MAXN * MAXN], x;
    int i, j, k;
    for (i = 0; i < n * n; i++) B[i] = ROLN_C(0.3) * roln_normal(s), CHECK(X[i] == (roln_real)(i % (n + 1) == 0));
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            for (x = ROLN_C(0.8) * (i == j), k = 0; k < n; k++) x += B[i * n + k] * B[j * n + k];
            X[i * n + j] = X[j * n + i] = x;
        }
}

/* Weights with biases, M well away from P, P and the layers random. */
static void set_weights(const roln_lnn *f, roln_real *th, uint64_t *s)
{
    const int n = f->n;
    int i, j;
    m.f = *f;
    layout(f);
    roln_lnn_init(f, th, s);
    for (i = 0; i < base_at; i++) th[i] = ROLN_C(0.9) * th[i] + ROLN_C(0.15) * roln_normal(s);
    for (i = friction_at + f->n; i < base_at && f->friction; i++) th[i] += 3; /* smooth enough for differences */
    if (f->base) random_spd(n, th + base_at, s);
    for (i = 0; i < f->layers; i++) {
        roln_real *x = th + layer_at[i];
        for (j = 0; j < ROLN_TRI(n); j++) CHECK(x[j] == 1), x[j] += ROLN_C(0.2) * roln_normal(s);
        random_spd(n, x + ROLN_TRI(n), s);
    }
    widen(roln_lnn_params(f), th, m.th);
}

static roln_real *weights(const roln_lnn *f, uint64_t *s)
{
    roln_real *th = fresh(roln_lnn_params(f));
    set_weights(f, th, s);
    return th;
}

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
        gx = zeros(p.planes * nb * in), gth = zeros(np), w = room_of(ROLN_MLP_BWD_WORK(p.planes, nb, wide));
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

/* ---- evaluation ---- */

/* Inputs of a map, or their gradients. */
typedef struct {
    roln_real *th, *s, *a[2], *y, *w;
} inputs;

static int extras(void) /* inputs a[] */
{
    return m.kind == INVERSE_W ? 2 : m.kind == ZDD || m.kind == INVERSE ? 1 : 0;
}

static int directions(void)
{
    return m.kind == INVERSE_W ? 2 : 1;
}

static int stepping(void)
{
    return m.kind >= ROLN_EULER && m.kind <= ROLN_MIDPOINT;
}

/* Numbers on the tapes of the map. */
static int tape_of(int keep, int nb)
{
    const int tapes = !keep ? 1 : stepping() ? ROLN_STAGES(m.kind) : m.kind == START ? 2 : 1;
    return tapes * TAPE(directions(), keep, nb);
}

static int work_of(int keep, int nb)
{
    if (m.kind == ZDD) return ROLN_LNN_ZDD_WORK(SZ, keep, nb);
    if (m.kind == INVERSE || m.kind == INVERSE_W) return ROLN_LNN_INVERSE_WORK(SZ, directions(), keep, nb);
    if (m.kind == START) return ROLN_LNN_START_WORK(SZ, keep, nb);
    return ROLN_LNN_STEP_WORK(SZ, m.kind, keep, nb);
}

static int back_work_of(int nb)
{
    if (m.kind == ZDD) return ROLN_LNN_ZDD_BWD_WORK(SZ, nb);
    if (m.kind == INVERSE) return ROLN_LNN_INVERSE_BWD_WORK(SZ, nb);
    if (m.kind == START) return ROLN_LNN_START_BWD_WORK(SZ, nb);
    return ROLN_LNN_STEP_BWD_WORK(SZ, m.kind, nb);
}

/* The most that a forward function takes without a backward to follow. */
static int any_work(int nb)
{
    const int step = ROLN_MAX(ROLN_LNN_STEP_WORK(SZ, ROLN_RK4, 0, nb), ROLN_LNN_STEP_WORK(SZ, ROLN_MIDPOINT, 0, nb));
    const int inverse = ROLN_LNN_INVERSE_WORK(SZ, 2, 0, nb), start = ROLN_LNN_START_WORK(SZ, 0, nb);
    return ROLN_MAX(ROLN_MAX(step, inverse), ROLN_MAX(start, TERMS_WORK));
}

/* A system of the weights x->th under the force of the test, if m has one. */
static roln_system system_of(const inputs *x, roln_real *gw, spring *sp, roln_force *fc)
{
    roln_system sys;
    sp->n = m.f.n, sp->w = x->w, sp->gw = gw;
    fc->eval = spring_eval, fc->bwd = spring_bwd, fc->jac = spring_jac, fc->ctx = sp;
    sys.theta = x->th, sys.force = m.force ? fc : NULL;
    return sys;
}

static roln_status run(const inputs *x, int keep, int nb, roln_real *out, roln_real *tape, roln_real *work)
{
    const roln_lnn *f = &m.f;
    const roln_real h = (roln_real)m.h;
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(x, NULL, &sp, &fc);
    if (m.kind == ZDD) return roln_lnn_zdd(f, keep, nb, x->th, x->s, x->a[0], out, tape, work);
    if (m.kind == INVERSE) return roln_lnn_inverse(f, keep, nb, x->th, x->s, NULL, x->a[0], out, tape, work);
    if (m.kind == INVERSE_W) return roln_lnn_inverse(f, keep, nb, x->th, x->s, x->a[1], x->a[0], out, tape, work);
    if (m.kind == START) return roln_lnn_start(f, &sys, keep, nb, h, x->s, x->s + nb * f->n, out, tape, work);
    return roln_lnn_step(f, &sys, m.kind, keep, nb, h, x->s, out, tape, work);
}

/* The backward; inverse with w has none. */
static void back(const inputs *x, int nb, roln_real *tape, const inputs *g, roln_real *work)
{
    const roln_lnn *f = &m.f;
    const roln_real h = (roln_real)m.h;
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(x, g->w, &sp, &fc);
    if (m.kind == ZDD) roln_lnn_zdd_bwd(f, nb, x->th, x->y, g->s, g->a[0], g->th, tape, work);
    else if (m.kind == INVERSE) roln_lnn_inverse_bwd(f, nb, x->th, x->y, g->s, g->a[0], g->th, tape, work);
    else if (m.kind == START) roln_lnn_start_bwd(f, &sys, nb, h, x->y, g->s, g->s + nb * f->n, g->th, tape, work);
    else if (stepping()) roln_lnn_step_bwd(f, &sys, m.kind, nb, h, x->y, g->s, g->th, tape, work);
}

/* The arrays of inputs (from m) and their lengths; the last is y, which has no gradient. */
enum { ARRAYS = 6 };
static void arrays(inputs *x, roln_real ***at, int *length)
{
    const int k = m.nb * m.f.n;
    at[0] = &x->th, at[1] = &x->s, at[2] = x->a, at[3] = x->a + 1, at[4] = &x->w, at[5] = &x->y;
    length[0] = roln_lnn_params(&m.f), length[1] = 2 * k, length[4] = 2 * m.f.n, length[5] = (two_planes() ? 2 : 1) * k;
    length[2] = extras() > 0 ? k : 0, length[3] = extras() > 1 ? k : 0;
}

static inputs zero_inputs(void)
{
    inputs g;
    roln_real **at[ARRAYS];
    int len[ARRAYS], q;
    arrays(&g, at, len);
    for (q = 0; q < ARRAYS; q++) *at[q] = zeros(len[q]);
    return g;
}

static inputs copy_inputs(inputs x)
{
    inputs c;
    roln_real **to[ARRAYS], **from[ARRAYS];
    int len[ARRAYS], q;
    arrays(&c, to, len), arrays(&x, from, len);
    for (q = 0; q < ARRAYS; q++) *to[q] = copy(len[q], *from[q]);
    return c;
}

/* Row r of x. */
static void row_of(const inputs *x, int r, inputs *one)
{
    const int n = m.f.n;
    int q;
    memcpy(one->s, x->s + r * n, (size_t)n * sizeof *x->s);
    memcpy(one->s + n, x->s + (m.nb + r) * n, (size_t)n * sizeof *x->s);
    for (q = 0; q < extras(); q++) memcpy(one->a[q], x->a[q] + r * n, (size_t)n * sizeof *x->s);
}

/* Random inputs of the map for the weights th, in x and in m. */
static inputs draw(const roln_lnn *f, roln_real *th, int kind, int nb, int force, uint64_t *seed)
{
    inputs x;
    int i;
    const int k = nb * f->n;
    ld *wide[ARRAYS];
    roln_real **at[ARRAYS];
    int len[ARRAYS];
    m.kind = kind, m.nb = nb, m.force = force && kind != ZDD && kind != INVERSE && kind != INVERSE_W, m.h = (ld)ROLN_C(0.05);
    x.th = th, x.s = fresh(2 * k);
    for (i = 0; i < 2 * k; i++) x.s[i] = ROLN_C(0.8) * roln_normal(seed);
    for (i = 0; i < k && kind == START; i++) x.s[k + i] = x.s[i] + (roln_real)m.h * x.s[k + i];
    for (i = 0; i < 2; i++) x.a[i] = normal(k, 1, seed);
    x.y = normal(2 * k, 1, seed), x.w = normal(2 * f->n, 0.5, seed);
    arrays(&x, at, len);
    wide[0] = m.th, wide[1] = m.s, wide[2] = m.a[0], wide[3] = m.a[1], wide[4] = m.w, wide[5] = m.y;
    for (i = 0; i < ARRAYS; i++) widen(len[i], *at[i], wide[i]);
    return x;
}

/* Condition: the largest change of an output of the map and of each array of gradients (theta by its parts) when every input
   moves by one eps, up or down: the most of six random moves of 128 eps. */
typedef struct {
    ld out, part[PARTS], g[ARRAYS];
} condition;

static ld apart(int n, const roln_real *a, const roln_real *b)
{
    ld d = 0;
    int i;
    for (i = 0; i < n; i++)
        if (!(fabsl((ld)a[i] - (ld)b[i]) <= d)) d = fabsl((ld)a[i] - (ld)b[i]);
    return d;
}

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

static ld largest(int n, const ld *x)
{
    ld top = 0;
    while (n--) top = ROLN_MAX(top, fabsl(x[n]));
    return top;
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

/* Gradient of theta against the twin, part by part, symmetric matrices along symmetric directions. */
static void check_theta(const roln_real *g, const condition *c)
{
    static const char *const name[PARTS] = {"gradient of the networks", "gradient of P", "gradient of gyro W",
                                            "gradient of gyro B"};
    static ld slope[MAXP], ref[PARTS][MAXP];
    static roln_real got[PARTS][MAXP];
    const int np = roln_lnn_params(&m.f);
    int k[PARTS] = {0, 0, 0, 0}, i, j, q;
    t_slopes_params(slope);
    for (i = 0; i < np; i++) {
        q = part_of(i, &j);
        CHECK(same(1, g + i, g + j));
        if (j < i) continue;
        ref[q][k[q]] = slope[i], got[q][k[q]++] = g[i] * (i == j ? 1 : 2);
    }
    for (q = 0; q < PARTS; q++)
        if (k[q]) near_by(name[q], k[q], got[q], ref[q], c->part[q], 2);
}

/* M, c, g, d, T, V lie one after the other; where term i begins. */
enum { NTERMS = 6 };
static int term_at(int i)
{
    const int n = m.f.n;
    return i == 0 ? 0 : i < 5 ? n * n + (i - 1) * n : n * n + 3 * n + i - 4;
}

static roln_status terms(const roln_real *th, const roln_real *s, int skip, roln_real *X, roln_real *tape, roln_real *w)
{
    roln_real *at[NTERMS];
    roln_terms_out out;
    int i;
    for (i = 0; i < NTERMS; i++) at[i] = i == skip ? NULL : X + term_at(i);
    out.M = at[0], out.c = at[1], out.g = at[2], out.d = at[3], out.T = at[4], out.V = at[5];
    return roln_lnn_terms(&m.f, th, s, &out, tape, w);
}

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

static void check_inverse(roln_lnn f, uint64_t *seed);

/* All maps of a variant, and one integrator. */
static void check_maps(int i, int scheme, uint64_t *seed)
{
    int k;
    for (k = 0; k < 3; k++) check_terms(variant(i), seed), check_inverse(variant(i), seed);
    check_map(variant(i), ZDD, 1, 0, 1, seed);
    check_map(variant(i), INVERSE, 1, 0, 1, seed);
    check_map(variant(i), INVERSE_W, 1 + (i == 3), 0, 1, seed);
    check_map(variant(i), START, 1, i % 3 == 0, 1, seed);
    check_map(variant(i), scheme, 1 + (i == 0), i % 3 == 0, 1, seed);
}

/* ---- properties of the motion ---- */

/* Order of the integrators against the twin's RK4 with many steps. */
static void test_order(uint64_t *seed)
{
#ifdef ROLN_DOUBLE
    static const double order[4] = {0, 1, 4, 2};
    int scheme, q, k, i, which;
    for (which = 0; which < 2; which++) {
        const roln_lnn f = which ? damped(behind(shape(2, 0, 3, 3, 2), 1)) : shape(2, 1, 3, 5, 4);
        roln_real *th = weights(&f, seed), *s0 = normal(4, 0.7, seed), *tape = fresh(TAPE(1, 0, 1));
        const roln_system sys = {th, NULL};
        const double T = 0.8;
        ld ref[4];
        m.force = 0;
        widen(4, s0, ref);
        for (k = 0; k < 200; k++) t_step(ROLN_RK4, (ld)T / 200, ref, ref);
        for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++) {
            roln_real *w = fresh(ROLN_LNN_STEP_WORK(SZ, scheme, 0, 1));
            double e[3];
            for (q = 0; q < 3; q++) {
                const int steps = (scheme == ROLN_EULER ? 64 : 8) << q;
                double s[4];
                memcpy(s, s0, sizeof s);
                for (k = 0; k < steps; k++) CHECK(roln_lnn_step(&f, &sys, scheme, 0, 1, T / steps, s, s, tape, w) == ROLN_OK);
                for (e[q] = 0, i = 0; i < 4; i++) e[q] += fabs(s[i] - (double)ref[i]);
            }
            CHECK_NEAR(log(e[0] / e[1]) / log(2), order[scheme], 0.15);
            CHECK_NEAR(log(e[1] / e[2]) / log(2), order[scheme], 0.1);
        }
        fresh_done();
    }
#else
    (void)seed;
#endif
}

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
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++) {
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

/* A bowl: V = sum softplus(3 z_i) + softplus(-3 z_i), one hidden layer; the mass network varies with z. */
static roln_real *bowl(const roln_lnn *f, uint64_t *seed)
{
    const int n = f->n, h = 2 * n, np = roln_mlp_params(&f->mass_net);
    roln_real *th = weights(f, seed), *W = th + np;
    int i, k;
    for (i = 0; i < roln_mlp_params(&f->potential_net); i++) W[i] = 0;
    for (i = 0; i < n; i++) W[i * h + i] = 3, W[i * h + n + i] = -3;
    for (k = 0; k < h; k++) W[n * h + h + k] = 1;
    for (i = base_at - ROLN_TRI(n); f->damping && i < base_at - ROLN_TRI(n) + n; i++) th[i] = ROLN_C(0.5);
    widen(roln_lnn_params(f), th, m.th);
    return th;
}

/* T + V, and the friction d = R zd, at s. */
static double energy(const roln_lnn *f, const roln_real *th, const roln_real *s, roln_real *tape, roln_real *w)
{
    roln_terms_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    roln_real T = 0, V = 0;
    out.T = &T, out.V = &V;
    CHECK(roln_lnn_terms(f, th, s, &out, tape, w) == ROLN_OK);
    return (double)T + (double)V;
}

static void friction(const roln_lnn *f, const roln_real *th, const roln_real *s, roln_real *d, roln_real *tape, roln_real *w)
{
    roln_terms_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    out.d = d;
    CHECK(roln_lnn_terms(f, th, s, &out, tape, w) == ROLN_OK);
}

static void test_energy(uint64_t *seed)
{
    int which, k;
    for (which = 0; which < 4; which++) {
        const roln_lnn f = which == 0   ? shape(2, 1, 2, 4, 0)
                           : which == 1 ? behind(shape(2, 1, 2, 4, 0), 2)
                           : which == 2 ? cholesky(shape(2, 0, 2, 4, 0))
                                        : damped(behind(shape(2, 0, 2, 4, 0), 1));
        roln_real *th = bowl(&f, seed), *s = fresh(4), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
        const roln_system sys = {th, NULL};
        const int steps = which == 0 ? 10000 : 4000;
        double e0, e, last = 0, mean[2] = {0, 0}, swing = 0, rise = 0;
        s[0] = ROLN_C(0.6), s[1] = ROLN_C(-0.3), s[2] = ROLN_C(0.2), s[3] = ROLN_C(0.5);
        e0 = energy(&f, th, s, tape, w);
        for (k = 0; k < steps; k++) {
            CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, ROLN_C(0.05), s, s, tape, w) == ROLN_OK);
            e = energy(&f, th, s, tape, w) - e0;
            mean[2 * k / steps] += 2 * e / steps;
            swing = fabs(e) > swing ? fabs(e) : swing;
            rise = e - last > rise ? e - last : rise;
            last = e;
        }
        if (f.damping) { /* never rises but by the error of the step, h^3, and comes to rest at the bottom, 2 n log 2 */
            BOUND("damped midpoint: rise of the energy in a step", (ld)(rise / e0), 1e-5L);
            BOUND("damped midpoint: energy left", (ld)((e0 + last) / (4 * log(2)) - 1), 1e-3L);
            CHECK(e0 + last > 0.999 * 4 * log(2));
        } else {
            const ld drift = (ld)(fabs(mean[1] - mean[0]) / e0); /* of the mean of each half */
            BOUND("midpoint: energy over 10^4 steps", (ld)(swing / e0), 3e-4L);
            BOUND("midpoint: drift of the energy", drift, sizeof(roln_real) == 4 ? 2e-5L : which ? 1e-5L : 1e-6L);
        }
        fresh_done();
    }
}

/* dE/dt = zd . (tau - d) along the flow: E after and before a short RK4 step under a constant force. */
static void const_eval(void *ctx, int nb, const roln_real *z, roln_real *tau)
{
    (void)z;
    memcpy(tau, ctx, sizeof *tau * (size_t)(nb * m.f.n));
}

static void test_power(uint64_t *seed)
{
    int rep;
    for (rep = 0; rep < 6 + 2 * VARIANTS; rep++) {
        roln_lnn f = rep < 6 ? shape(3, rep % 2, 3, 6, 5) : variant(rep % VARIANTS);
        const int n = f.n;
        roln_real *th = weights(&f, seed);
        const inputs x = draw(&f, th, ZDD, 1, 0, seed);
        roln_real *a = fresh(2 * n), *d = fresh(n), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
        const roln_real h = sizeof(roln_real) == 8 ? ROLN_C(1e-3) : ROLN_C(2e-2);
        double e[2], power = 0, size = 0;
        roln_force fc;
        roln_system sys;
        int q, i;
        fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = x.a[0];
        sys.theta = th, sys.force = &fc;
        for (q = 0; q < 2; q++) {
            CHECK(roln_lnn_step(&f, &sys, ROLN_RK4, 0, 1, q ? h : -h, x.s, a, tape, w) == ROLN_OK);
            e[q] = energy(&f, th, a, tape, w);
        }
        friction(&f, th, x.s, d, tape, w);
        for (i = 0; i < n; i++) {
            const double watt = (double)x.s[n + i] * ((double)x.a[0][i] - (double)d[i]);
            power += watt, size += fabs(watt);
        }
        power -= (e[1] - e[0]) / (2 * (double)h);
        BOUND("dE/dt = zd . (tau - d)", (ld)(fabs(power) / (1 + size)), sizeof(roln_real) == 8 ? 1e-5L : 4e-3L);
        fresh_done();
    }
}

/* zd^T d = |L^T zd|^2 >= 0, but for the rounding of the sum, whatever the weights. */
static void test_damping(uint64_t *seed)
{
    int rep, i, j;
    for (rep = 0; rep < 3000; rep++) {
        const int n = 1 + rep % 5;
        const roln_lnn f = damped(rep % 3 ? shape(n, 0, 2, 2, 0) : cholesky(shape(n, 0, 2, 2, 0)));
        roln_real *th = weights(&f, seed), *s = normal(2 * n, 1, seed), *d = fresh(n);
        roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(TERMS_WORK);
        ld u[ROLN_TRI(MAXN)], L[MAXN * MAXN], x[2 * MAXN], power = 0, size = 0, y, scale = (ld)roln_normal(seed);
        for (i = damper_at; i < base_at; i++) th[i] = (roln_real)(10 * scale * scale * (ld)th[i]); /* from nothing to strong */
        for (i = base_at - n; rep % 7 == 0 && i < base_at; i++) th[i] = 0;
        widen(roln_lnn_params(&f), th, m.th), widen(2 * n, s, x);
        friction(&f, th, s, d, tape, w);
        t_mlp(&f.damper_net, m.th + damper_at, x, u);
        t_low(n, u, 0, L);
        for (j = 0; j < n; j++) {
            for (y = 0, i = 0; i < n; i++) y += L[i * n + j] * x[n + i];
            for (i = 0; i < n; i++) size += fabsl(x[n + i] * L[i * n + j] * y);
        }
        for (i = 0; i < n; i++) power += x[n + i] * (ld)d[i];
        BOUND("damping: -zd . d (eps)", -power / (EPS * (size + 1e-9L)), 8);
        fresh_done();
    }
}

/* Dry friction is c tanh(zd / v), takes power whatever c and v are, at every velocity, and begins with e^-2. */
static void test_rubbing(uint64_t *seed)
{
    int rep, i;
    for (rep = 0; rep < 1000; rep++) {
        const int n = 1 + rep % 5;
        const roln_lnn f = rubbing(rep % 2 ? shape(n, 0, 2, 2, 0) : damped(cholesky(shape(n, 0, 2, 2, 0))));
        roln_real *th = weights(&f, seed), *s = normal(2 * n, pow(10, rep % 9 - 4), seed), *d = fresh(n), *smooth = fresh(n);
        roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(TERMS_WORK);
        if (rep < 20) {
            roln_lnn_init(&f, th, seed);
            for (i = friction_at; i < base_at; i++) CHECK_NEAR(th[i], -2, 0);
        }
        for (i = 0; i < n; i++) s[i] = roln_normal(seed);
        for (i = friction_at; i < base_at; i++) th[i] = 3 * roln_normal(seed);
        for (i = 0; f.damping && i < friction_at - damper_at; i++) th[damper_at + i] = 0;
        friction(&f, th, s, d, tape, w);
        for (i = 0; i < n; i++) {
            const ld c = expl((ld)th[friction_at + i]), v = expl((ld)th[friction_at + n + i]), want = c * tanhl((ld)s[n + i] / v);
            CHECK(d[i] * s[n + i] >= 0);
            BOUND("friction (eps)", fabsl((ld)d[i] - want) / (EPS * fabsl(want)), 12);
            th[friction_at + i] = -200; /* e^-200: none */
        }
        friction(&f, th, s, smooth, tape, w);
        for (i = 0; i < n; i++) CHECK_NEAR(smooth[i], 0, 1e-30);
        fresh_done();
    }
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
    roln_terms_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    out.c = c, out.g = g, out.d = d;
    CHECK(roln_lnn_terms(&m.f, th, s, &out, tape, work) == ROLN_OK);
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

/* Whole turns of an angle change nothing but by the rounding of the angle: terms, zdd, the start from two positions. An angle
   beyond 2^20 is none. */
static void check_turned(roln_lnn f, int turns, uint64_t *seed)
{
    const int n = f.n, nx = n * n + 3 * n + 2;
    roln_real *th = weights(&f, seed), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    roln_real *X[2], *zdd[2], *s1[2], *s, *z0, *out = zeros(2 * n), *before = copy(2 * n, out);
    roln_system sys = {NULL, NULL};
    ld ref[MAXN * MAXN + 3 * MAXN + 2];
    inputs x = draw(&f, th, ZDD, 1, 0, seed);
    int k, i;
    sys.theta = th;
    for (k = 0; k < 2; k++) {
        X[k] = fresh(nx), zdd[k] = fresh(n), s1[k] = fresh(2 * n), s = copy(2 * n, x.s), z0 = copy(n, x.s);
        for (i = 0; i < n; i++) {
            const ld turn = k && (f.angles >> i & 1) ? 8 * atanl(1) * turns : 0;
            s[i] = (roln_real)((ld)s[i] + turn), z0[i] = (roln_real)((ld)z0[i] - (ld)ROLN_C(0.03125) * (ld)s[n + i] - turn);
        }
        CHECK(terms(th, s, -1, X[k], tape, w) == ROLN_OK);
        CHECK(roln_lnn_zdd(&f, 0, 1, th, s, x.a[0], zdd[k], tape, w) == ROLN_OK);
        CHECK(roln_lnn_start(&f, &sys, 0, 1, ROLN_C(0.03125), z0, s, s1[k], tape, w) == ROLN_OK);
        CHECK(same(n, s, s1[k]));
    }
    widen(nx, X[0], ref);
    BOUND("turns: terms (eps a turn)", distance(nx, X[1], ref) / EPS / (1 + fabsl((ld)turns)), 8);
    widen(n, zdd[0], ref);
    BOUND("turns: zdd (eps a turn)", distance(n, zdd[1], ref) / EPS / (1 + fabsl((ld)turns)), 40);
    BOUND("turns: start (eps a turn / h)", apart(n, s1[0] + n, s1[1] + n) / EPS / (1 + fabsl((ld)turns)) / 32, 16);
    for (i = 0; i < n; i++) {
        s = copy(2 * n, x.s);
        s[i] = 1048577;
        k = roln_lnn_zdd(&f, 0, 1, th, s, x.a[0], out, tape, w) == ROLN_E_NOT_FINITE;
        CHECK(!(f.angles >> i & 1) || (k && same(n, out, before)));
        memcpy(out, before, (size_t)n * sizeof *out);
    }
    fresh_done();
}

static void test_turns(uint64_t *seed)
{
    static const int turns[] = {1, -1, 3, -20, 100};
    int i, rep;
    for (rep = 0; rep < 20; rep++)
        for (i = VARIANTS; i < TURNING; i++) check_turned(variant(i), turns[rep % 5], seed);
}

/* ---- status and edges ---- */

/* Every call that can fail, on the same inputs, nb = 2: all must report st and leave what they write alone. */
static void check_fails(const roln_lnn *f, const roln_real *th, const roln_real *s, const roln_real *tau, roln_status st,
                        int terms_too)
{
    const int n = f->n, nx = n * n + 3 * n + 2;
    roln_real *tape = fresh(TAPE(2, 0, 2)), *w = fresh(any_work(2)), *out = zeros(4 * n), *zero = zeros(4 * n + nx), *X = zeros(nx);
    roln_real s1[2 * MAXN];
    roln_force fc;
    roln_system sys;
    int scheme;
    fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = copy(2 * n, tau);
    sys.theta = th, sys.force = &fc;
    memcpy(s1, s, sizeof *s * (size_t)n), memcpy(s1 + n, s + 2 * n, sizeof *s * (size_t)n);
    CHECK(roln_lnn_zdd(f, 0, 2, th, s, tau, out, tape, w) == st);
    CHECK(roln_lnn_inverse(f, 0, 2, th, s, NULL, tau, out, tape, w) == st);
    CHECK(roln_lnn_inverse(f, 0, 2, th, s, tau, tau, out, tape, w) == st);
    CHECK(roln_lnn_start(f, &sys, 0, 2, ROLN_C(0.1), s, s + 2 * n, out, tape, w) == st);
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++)
        CHECK(roln_lnn_step(f, &sys, scheme, 0, 2, ROLN_C(0.01), s, out, tape, w) == st);
    if (terms_too) CHECK(terms(th, s1, -1, X, tape, w) == st);
    CHECK(same(4 * n, out, zero) && same(nx, X, zero));
}

/* What NaN in parameter i makes. */
static roln_status expected(const roln_lnn *f, int i)
{
    int mirror, part = part_of(i, &mirror);
    if (part == NETWORKS) {
        const int in_mass = i < roln_mlp_params(&f->mass_net);
        return f->mass == ROLN_CHOLESKY && in_mass ? ROLN_E_NOT_SPD : ROLN_E_NOT_FINITE;
    }
    if (part == BASE) return ROLN_E_NOT_SPD;
    if (part == GYRO_W) return ROLN_E_NOT_FINITE;
    /* of B: met by the next roln_eig, or by the Cholesky factor of M */
    return i < layer_at[f->layers - 1] ? ROLN_E_NOT_FINITE : ROLN_E_NOT_SPD;
}

enum { STATUS_SHAPES = 7 };
static roln_lnn status_shape(int i)
{
    switch (i) {
    case 0: return shape(2, 0, 2, 3, 0);
    case 1: return shape(2, 1, 2, 3, 0);
    case 2: return cholesky(shape(2, 0, 2, 3, 0));
    case 3: return damped(shape(2, 1, 2, 3, 0));
    case 4: return damped(behind(shape(2, 1, 2, 2, 0), 1));
    case 5: return behind(shape(2, 0, 2, 2, 0), 2); /* the first layer can spoil the log of the second */
    default: return damped(cholesky(shape(2, 0, 2, 2, 0)));
    }
}

#define DRAW roln_real *th = weights(f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed)

/* `bad`, which is not finite, in every number of the states, of the forces and of the parameters. */
static void check_not_finite(const roln_lnn *f, roln_real bad, uint64_t *seed)
{
    const int np = roln_lnn_params(f), nm = roln_mlp_params(&f->mass_net), hid = 3 * f->mass_net.size[1];
    int i, j;
    for (i = 0; i < 8; i++) {
        DRAW;
        s[i] = bad;
        check_fails(f, th, s, tau, ROLN_E_NOT_FINITE, i % 4 < 2);
        fresh_done();
    }
    for (i = 0; i < 4; i++) {
        DRAW;
        tau[i] = bad;
        check_fails(f, th, s, tau, ROLN_E_NOT_FINITE, 0);
        fresh_done();
    }
    for (i = 0; i < np; i++) {
        DRAW;
        const int in_net = i < nm ? i : i < damper_at ? i - nm : i - damper_at, part = part_of(i, &j);
        if (i == damper_at - 1) continue; /* the bias of V moves nothing */
        if (bad == bad && part == NETWORKS && in_net < hid) continue; /* infinity: softplus' of -Inf is 0, may stay finite */
        if (part == BASE && j > i) continue; /* the upper triangle of P is not read */
        th[i] = bad;
        check_fails(f, th, s, tau, expected(f, i), 1);
        fresh_done();
    }
}

/* Masses without a range, P not SPD. */
static void check_mass_fails(const roln_lnn *f, uint64_t *seed)
{
    const int nm = roln_mlp_params(&f->mass_net), w = f->n;
    int i;
    if (f->mass != ROLN_CHOLESKY) {
        DRAW;
        for (i = 0; i < w; i++) th[nm - ROLN_TRI(w) + i] = 120; /* biases of the diagonal of U */
        check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
        th[nm - ROLN_TRI(w)] = -120, th[nm - ROLN_TRI(w) + 1] = 0;
        check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
        fresh_done();
    }
    for (i = 0; f->base && i < w; i++) {
        DRAW;
        th[base_at + i * (w + 1)] = i % 2 ? 0 : -1;
        check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
        fresh_done();
    }
}

/* Layer i: W too large for exp, and B not SPD, of which the next log, or the factor of M, tells. */
static void check_layer_fails(const roln_lnn *f, int i, uint64_t *seed)
{
    const int n = f->n;
    roln_real *W, keep[ROLN_TRI(MAXN)];
    int j;
    DRAW;
    W = th + layer_at[i];
    memcpy(keep, W, sizeof *keep * (size_t)ROLN_TRI(n));
    for (j = 0; j < ROLN_TRI(n); j++) W[j] *= 3000;
    check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
    memcpy(W, keep, sizeof *keep * (size_t)ROLN_TRI(n));
    for (j = 0; j < n * n; j++) W[ROLN_TRI(n) + j] = j % (n + 1) ? 0 : -1;
    check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
    fresh_done();
}

/* L = 0: M = least I, least 0. */
static void check_cholesky_fails(roln_lnn f0, uint64_t *seed)
{
    roln_lnn *f = &f0;
    const int nm = roln_mlp_params(&f->mass_net);
    int i;
    DRAW;
    for (i = 0; i < nm; i++) th[i] = 0;
    f->least = 0, m.f.least = 0;
    check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
    fresh_done();
}
#undef DRAW

/* Steps that leave the range, or whose h is none. */
static void check_step_fails(const roln_lnn *f, uint64_t *seed)
{
    roln_real *th = weights(f, seed), *s = normal(8, 0.7, seed), out[8], zero[8];
    roln_real *tape = fresh(TAPE(1, 0, 2)), *w = fresh(any_work(2));
    const roln_system sys = {th, NULL};
    int i;
    memset(zero, 0, sizeof zero), memset(out, 0, sizeof out);
    for (i = 4; i < 8; i++) s[i] *= 300; /* far outside */
    CHECK(roln_lnn_step(f, &sys, ROLN_MIDPOINT, 0, 2, 1, s, out, tape, w) != ROLN_OK);
    CHECK(same(8, out, zero));
    for (i = 4; i < 8; i++) s[i] /= 300;
    CHECK(roln_lnn_step(f, &sys, ROLN_EULER, 0, 2, (roln_real)NAN, s, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(roln_lnn_step(f, &sys, ROLN_RK4, 0, 2, (roln_real)INFINITY, s, out, tape, w) != ROLN_OK);
    CHECK(roln_lnn_start(f, &sys, 0, 2, 0, s, s + 4, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(roln_lnn_start(f, &sys, 0, 2, (roln_real)NAN, s, s + 4, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(same(8, out, zero));
    fresh_done();
}

static void test_status(uint64_t *seed)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    int which, b, i;
    for (which = 0; which < STATUS_SHAPES; which++) {
        roln_lnn f = status_shape(which);
        for (b = 0; b < 3; b++) check_not_finite(&f, bad[b], seed);
        check_mass_fails(&f, seed);
        for (i = 0; i < f.layers; i++) check_layer_fails(&f, i, seed);
        if (f.mass == ROLN_CHOLESKY) check_cholesky_fails(f, seed);
        check_step_fails(&f, seed);
    }
}

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

/* Layers as roln_lnn_init makes them: the matrix passes as it is. */
static void test_identity(uint64_t *seed)
{
    int q, i;
    for (q = 1; q < 4; q++) {
        roln_lnn f = shape(3, 1, 2, 4, 0), f1 = behind(f, q);
        roln_terms_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
        roln_real *th, *th1, *s, M[2][9], *tape, *w;
        ld ref[9];
        th = weights(&f1, seed), s = normal(6, 0.8, seed), th1 = copy(roln_lnn_params(&f1), th);
        roln_lnn_init(&f1, th1, seed);
        for (i = 0; i < layer_at[0]; i++) th1[i] = th[i];
        tape = fresh(TAPE(1, 0, 1)), w = fresh(TERMS_WORK);
        out.M = M[1];
        CHECK(roln_lnn_terms(&f1, th1, s, &out, tape, w) == ROLN_OK);
        set_sizes(&f);
        tape = fresh(TAPE(1, 0, 1)), w = fresh(TERMS_WORK);
        out.M = M[0];
        CHECK(roln_lnn_terms(&f, th1, s, &out, tape, w) == ROLN_OK);
        widen(9, M[0], ref);
        BOUND("layers that change nothing: M (eps)", distance(9, M[1], ref) / EPS, 40);
        fresh_done();
    }
}

/* Networks four times as steep are those of 4 z, bit for bit; nothing but their first layers moves. */
static void check_steep(const roln_lnn *f, uint64_t *seed)
{
    const int n = f->n, params = roln_lnn_params(f);
    roln_real *th = weights(f, seed), *steep = copy(params, th), *s = normal(2 * n, 0.2, seed), *s4 = copy(2 * n, s);
    roln_real M[2][MAXN * MAXN], d[2][MAXN], T[2], V[2];
    roln_terms_out out = {M[0], NULL, NULL, d[0], T, V};
    int i, moved = 0;
    set_sizes(f);
    roln_lnn_steepen(f, 4, steep);
    for (i = 0; i < params; i++) moved += !same(1, th + i, steep + i);
    CHECK(moved == (2 + f->damping) * n * f->mass_net.size[1]);
    for (i = 0; i < n; i++) s4[i] *= 4;
    CHECK(roln_lnn_terms(f, th, s4, &out, fresh(TAPE(1, 0, 1)), fresh(TERMS_WORK)) == ROLN_OK);
    out.M = M[1], out.d = d[1], out.T = T + 1, out.V = V + 1;
    CHECK(roln_lnn_terms(f, steep, s, &out, fresh(TAPE(1, 0, 1)), fresh(TERMS_WORK)) == ROLN_OK);
    CHECK(same(n * n, M[0], M[1]) && same(n, d[0], d[1]) && same(1, T, T + 1) && same(1, V, V + 1));
    fresh_done();
}

/* Where the mass alone is wanted, by roln_guard_tick and roln_inertia, no gradient is computed. */
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

/* One joint with log M = 39.9925 + z/100 and no potential, h v = 1: exp holds M up to z = 3/4. So one evaluation of a step alone
   fails: the last one, of M at the end; with a force that of a later iteration at the middle; or the first. */
static void test_edge(uint64_t *seed)
{
    const roln_lnn f = shape(1, 0, 2, 1, 0);
    roln_real *th = weights(&f, seed), s[2] = {0, 1}, sn[2] = {0, 0}, z[2] = {0, 1}, push;
    roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    roln_terms_out none = {NULL, NULL, NULL, NULL, NULL, NULL};
    roln_force fc;
    roln_system sys;
    int i;
    for (i = 0; i < roln_lnn_params(&f); i++) th[i] = 0;
    th[0] = 1, th[1] = 20; /* softplus(z + 20) = z + 20 to rounding */
    th[2] = ROLN_C(0.01), th[3] = ROLN_C(39.7925);
    fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = &push;
    sys.theta = th, sys.force = NULL;
    for (i = 0; i < 3; i++) {
        const roln_real at[2] = {(roln_real)i / 2, 0};
        CHECK(roln_lnn_terms(&f, th, at, &none, tape, w) == (i == 2 ? ROLN_E_RANGE : ROLN_OK));
    }
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_start(&f, &sys, 0, 1, 1, z, z + 1, sn, tape, w) == ROLN_E_RANGE);
    s[1] = 0, push = 4 * roln_exp(40), sys.force = &fc; /* v = 0 at first, then 2 */
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_step(&f, &sys, ROLN_RK4, 0, 1, 2, s, sn, tape, w) == ROLN_E_RANGE);
    s[0] = 1, s[1] = -1, z[0] = 2, z[1] = ROLN_C(0.5), sys.force = NULL; /* the first evaluation alone fails */
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_start(&f, &sys, 0, 1, 1, z, z + 1, sn, tape, w) == ROLN_E_RANGE);
    CHECK(sn[0] == 0 && sn[1] == 0);
    s[0] = s[1] = 0;
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_OK);
    fresh_done();
}

/* The backward of a midpoint step makes ROLN_MIDPOINT_ITERS iterations, no more and no less: M = 1, V = 0 and the spring
   tau = -3 z at rest with h = 1, where the iteration of mu contracts by 3/4 and is far from its end after ten. */
static void test_iterations(uint64_t *seed)
{
    const roln_lnn f = shape(1, 0, 2, 1, 0);
    const roln_real w[2] = {0, -3}, gsn[2] = {1, ROLN_C(0.5)}, s[2] = {0, 0};
    roln_real *th = weights(&f, seed), sn[2], gs[2] = {0, 0}, gw[2] = {0, 0}, *tape, *work;
    spring sp = {1, NULL, NULL};
    roln_force fc;
    roln_system sys;
    ld mu = 0;
    int i;
    for (i = 0; i < roln_lnn_params(&f); i++) th[i] = 0;
    sp.w = w, sp.gw = gw;
    fc.eval = spring_eval, fc.bwd = spring_bwd, fc.jac = spring_jac, fc.ctx = &sp;
    sys.theta = th, sys.force = &fc;
    m.kind = ROLN_MIDPOINT;
    tape = fresh(tape_of(1, 1)), work = fresh(ROLN_MAX(work_of(1, 1), back_work_of(1)));
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 1, 1, 1, s, sn, tape, work) == ROLN_OK);
    roln_lnn_step_bwd(&f, &sys, ROLN_MIDPOINT, 1, 1, gsn, gs, NULL, tape, work);
    for (i = 0; i < ROLN_MIDPOINT_ITERS; i++) /* mu <- g_z+ + dS/dz_m / 2 with dS/dz_m = -3 (g_p+ + mu / 2) */
        mu = 1 - 1.5L * (0.5L + mu / 2);
    BOUND("midpoint backward: iterations, z (eps)", fabsl((ld)gs[0] - (1 - 3 * (0.5L + mu / 2))) / EPS, 8);
    BOUND("midpoint backward: iterations, zd (eps)", fabsl((ld)gs[1] - (0.5L + mu)) / EPS, 8);
    fresh_done();
}

/* A map writes its tapes and its work, forward and back, up to the last number of the declared sizes. */
static void check_room(roln_lnn f, int kind, int keep, int nb, uint64_t *seed)
{
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, kind, nb, 1, seed), g = zero_inputs();
    roln_real *out = fresh(2 * nb * f.n), *tape = fresh(tape_of(keep, nb)), *work = fresh(work_of(keep, nb));
    if (kind == ROLN_MIDPOINT) m.h = (ld)ROLN_C(1e-3); /* any of the shapes converges */
    CHECK(run(&x, keep, nb, out, room_of(tape_of(keep, nb)), work) == ROLN_OK);
    CHECK_ROOM();
    CHECK(run(&x, keep, nb, out, tape, room_of(work_of(keep, nb))) == ROLN_OK);
    CHECK_ROOM();
    if (keep) {
        back(&x, nb, tape, &g, room_of(back_work_of(nb)));
        CHECK_ROOM();
    }
    fresh_done();
}

static void check_terms_room(roln_lnn f, uint64_t *seed)
{
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, ZDD, 1, 0, seed);
    roln_real *X = fresh(f.n * f.n + 3 * f.n + 2), *tape = fresh(TAPE(1, 0, 1)), *work = fresh(TERMS_WORK);
    CHECK(terms(th, x.s, -1, X, room_of(TAPE(1, 0, 1)), work) == ROLN_OK);
    CHECK_ROOM();
    CHECK(terms(th, x.s, -1, X, tape, room_of(TERMS_WORK)) == ROLN_OK);
    CHECK_ROOM();
    fresh_done();
}

static void check_rooms(roln_lnn f, int nb, uint64_t *seed)
{
    static const int kinds[] = {ZDD, INVERSE, START, ROLN_EULER, ROLN_RK4, ROLN_MIDPOINT};
    int i;
    for (i = 0; i < 12; i++) check_room(f, kinds[i / 2], i % 2, nb, seed);
    check_room(f, INVERSE_W, 0, nb, seed);
    if (nb == 1) check_terms_room(f, seed);
}

static void test_rooms(uint64_t *seed)
{
    int i, nb;
    for (nb = 1; nb <= 5; nb += 4) {
        for (i = 0; i < VARIANTS; i++) check_rooms(variant(i), nb, seed);
        for (i = 0; i < 2; i++) { /* perceptrons of one to four hidden layers, narrow and wide, and wider than anything else */
            check_rooms(shape(4, i, 2, 1, 0), nb, seed), check_rooms(shape(1, i, 2, 9, 0), nb, seed);
            check_rooms(shape(3, i, 3, 9, 2), nb, seed), check_rooms(shape(3, i, 3, 2, 9), nb, seed);
            check_rooms(damped(shape(3, i, 4, 3, 6)), nb, seed), check_rooms(damped(shape(2, i, 5, 5, 2)), nb, seed);
            check_rooms(shape(2, i, 3, 20, 20), nb, seed), check_rooms(damped(shape(5, i, 3, 2, 1)), nb, seed);
        }
        check_rooms(cholesky(shape(4, 0, 3, 2, 3)), nb, seed), check_rooms(damped(cholesky(shape(4, 0, 2, 8, 0))), nb, seed);
        check_rooms(behind(shape(4, 0, 3, 2, 5), 2), nb, seed), check_rooms(behind(shape(4, 1, 2, 9, 0), 1), nb, seed);
    }
}

void TEST_NAME(lnn)(void)
{
    static const roln_mlp nets[] = {{1, {3, 2}}, {2, {2, 5, 3}}, {3, {3, 4, 6, 2}}, {6, {2, 3, 4, 3, 2, 4, 1}}};
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
        for (i = ROLN_EULER; i <= ROLN_MIDPOINT; i++) {
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
    test_order(&seed);
    test_energy(&seed);
    test_power(&seed);
    test_damping(&seed);
    test_status(&seed);
    test_repeated(&seed);
    test_identity(&seed);
    test_edge(&seed);
    test_iterations(&seed);
    test_rooms(&seed);
    test_turns(&seed);
    test_rubbing(&seed);
    for (i = VARIANTS; i < ALL; i++) {
        const roln_lnn f = variant(i);
        for (T = ROLN_EULER; T <= ROLN_MIDPOINT; T++) check_maps(i, T, &seed);
        check_start(f, i % 2, &seed);
        check_linear(f, i % 2 == 0, &seed);
        check_rooms(f, 1, &seed), check_rooms(f, 5, &seed);
    }
    print_bounds();
}
