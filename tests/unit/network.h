/* SPDX-License-Identifier: MIT */
/* network.h - what the tests of roln_lnn.h share. A twin in long double written from the definitions: naive perceptron, exp by
   Taylor series, M = P exp(P^-1 U), SPD layers by Jacobi, the full tensor dM/dz and Christoffel symbols, Gaussian elimination.
   Shapes, random weights and inputs of them. One call for every map of the library: forward and inverse dynamics, steps, start.
   Include after roln_lnn.h. */
#ifndef NETWORK_H
#define NETWORK_H

#include "twin.h"
#include "room.h"

#define MAXN 5
#define MAXB 5
#define MAXP 1600
#define NOISE (2e-13L / EPS) /* rounding of the nested differences of the twins: 0 in float, 900 in double */

/* The maps under test: the forward dynamics, the integrators by their own names, and */
enum { ZDD = 0, INVERSE = 5, INVERSE_W = 6, START = 7 };

/* A network, and all that a map of it reads: the state s (start: z0, z1), a[0] (tau_z or zdd), a[1] (w), the force w, and the
   weights y of its outputs in a loss. */
static struct {
    roln_lnn f;
    int nb, kind, force;
    ld h, th[MAXP], s[2 * MAXB * MAXN], a[2][MAXB * MAXN], y[2 * MAXB * MAXN], w[2 * MAXN];
} m;

/* The sizes of a shape for the macros: SZ(n), SZ(base) .. */
static struct {
    int n, base, damping, damper, friction, cossin, cholesky, formed, hidden, wide, layers;
    int cols, outputs, polynomials, hidden_v, wide_v, planes_1, planes_2, planes_3, back, back_v;
    int row_mass, row_dm, row_bwd, row_bwd_0, row_bwd_1, row_bwd_2, row_jac_1, row_jac_2, curve_1, curve_2;
    int row_mass_0, row_gradient_0, row_gradient_1, row_all_0, row_all_1;
    int stage_1, step_1, dissipation, zdd_jac, midpoint_row, stick_slopes;
} sz;
#define SZ(x) sz.x

ROLN_FN void set_sizes(const roln_lnn *f)
{
    const roln_mlp *net = &f->mass_net;
    int i, even = 0, odd = 0, odd_v = 0;
    memset(&sz, 0, sizeof sz);
    sz.n = f->n, sz.base = f->base, sz.damping = f->damping, sz.friction = f->friction;
    sz.damper = f->damping ? f->damper_net.size[f->damper_net.layers] : 0;
    sz.cossin = f->angles ? net->size[0] : 0;
    sz.cholesky = f->mass == ROLN_CHOLESKY, sz.layers = f->layers, sz.formed = sz.cholesky || f->layers > 0;
    for (i = 0; i < net->layers; i++) {
        const int of_v = f->potential_net.size[i];
        if (i % 2) odd = ROLN_MAX(odd, net->size[i]), odd_v = ROLN_MAX(odd_v, of_v);
        else even = ROLN_MAX(even, net->size[i]);
        if (i > 0) sz.hidden += net->size[i], sz.hidden_v += of_v;
    }
    sz.polynomials = net->degree > 0;
    sz.back = 2 * sz.polynomials * sz.hidden, sz.back_v = 2 * sz.polynomials * sz.hidden_v;
    sz.planes_1 = ROLN_MAX(sz.hidden, sz.hidden_v), sz.planes_2 = ROLN_MAX(2 * sz.hidden, sz.hidden_v);
    sz.planes_3 = ROLN_MAX(3 * sz.hidden, sz.hidden_v);
    sz.wide = even + odd, sz.wide_v = even + odd_v;
    sz.cols = f->squares > 0 ? f->squares : f->n, sz.outputs = net->size[net->layers];
    sz.row_mass = ROLNI_MASS_ROW_WORK(SZ), sz.row_dm = ROLNI_DM_WORK(SZ), sz.row_bwd = ROLNI_ROW_BWD_WORK(SZ, 0, 0);
    sz.row_bwd_0 = ROLNI_ROW_BWD_WORK(SZ, 0, 1), sz.row_bwd_1 = ROLNI_ROW_BWD_WORK(SZ, 1, 1);
    sz.row_bwd_2 = ROLNI_ROW_BWD_WORK(SZ, 2, 1);
    sz.curve_1 = ROLNI_CURVATURE_WORK(SZ, 1), sz.curve_2 = ROLNI_CURVATURE_WORK(SZ, 2);
    sz.row_jac_1 = ROLNI_MOTION_JAC_WORK(SZ, 1), sz.row_jac_2 = ROLNI_MOTION_JAC_WORK(SZ, 2);
    sz.row_mass_0 = ROLNI_MASS_ONLY_WORK(SZ);
    sz.row_gradient_0 = ROLNI_GRADIENT_ROW_WORK(SZ, 0), sz.row_gradient_1 = ROLNI_GRADIENT_ROW_WORK(SZ, 1);
    sz.row_all_0 = ROLNI_ALL_ROW_WORK(SZ, 0), sz.row_all_1 = ROLNI_ALL_ROW_WORK(SZ, 1);
    sz.stage_1 = ROLNI_STAGE_WORK(SZ, 1, 1), sz.dissipation = ROLNI_DISSIPATION_JAC_WORK(SZ);
    sz.zdd_jac = ROLN_LNN_ZDD_JAC_WORK(SZ), sz.midpoint_row = ROLNI_MIDPOINT_ROW_WORK(SZ);
    sz.stick_slopes = ROLNI_STICK_SLOPES_WORK(SZ);
}

#define TAPE(dirs, keep, nb) ROLN_LNN_TAPE(SZ, dirs, keep, nb)
#define TERMS_WORK ROLN_LNN_DYNAMICS_WORK(SZ)

/* True if f has the numbers of the richer law of friction. */
ROLN_FN int drives(const roln_lnn *f)
{
    return f->friction == 2 || f->friction == -2;
}

/* Where the parts of theta begin, in the order that the header tells. */
static int damper_at, friction_at, base_at, layer_at[ROLN_LAYERS_MAX];

ROLN_FN void layout(const roln_lnn *f)
{
    const int n = f->n;
    int i, at;
    damper_at = roln_mlp_params(&f->mass_net) + roln_mlp_params(&f->potential_net);
    friction_at = damper_at + (f->damping ? roln_mlp_params(&f->damper_net) : 0);
    base_at = at = friction_at + (drives(f) ? 6 : f->friction ? 2 : 0) * f->n;
    if (f->base) at += n * n;
    for (i = 0; i < f->layers; i++, at += ROLN_TRI(n) + n * n) layer_at[i] = at;
    CHECK(at == roln_lnn_params(f));
    set_sizes(f);
}

/* The part of theta that number i belongs to; for the entry of a symmetric matrix *mirror is its transpose, else i. */
enum { NETWORKS, BASE, GYRO_W, GYRO_B, PARTS };
ROLN_FN int part_of(int i, int *mirror)
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

/* All products of Chebyshev polynomials of total degree e in x_0 .. x_last: by their last variable, then by its power. Returns
   their number. */
ROLN_FN int t_products(const ld *x, int e, int last, ld *y)
{
    int i, j, k, count = 0;
    for (i = 0; i <= last; i++) {
        ld before = 1, T = x[i];
        for (k = 1; k <= e; k++) {
            ld rest[64];
            const ld next = 2 * x[i] * T - before;
            const int others = k == e ? 1 : t_products(x, e - k, i - 1, rest);
            for (j = 0; j < others; j++) y[count++] = T * (k == e ? 1 : rest[j]);
            before = T, T = next;
        }
    }
    return count;
}

ROLN_FN void t_mlp(const roln_mlp *f, const ld *th, const ld *x, ld *y)
{
    ld a[2][64];
    int l = f->degree > 0, i, j, e;
    for (i = 0; i < f->size[0]; i++) a[l][i] = x[i];
    for (e = 2; e <= f->degree; e++) i += t_products(x, e, f->size[0] - 1, a[1] + i);
    CHECK(i == f->size[l]);
    for (; l < f->layers; l++) {
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
ROLN_FN void t_net(const roln_mlp *net, const ld *th, const ld *z, ld *y)
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

ROLN_FN void t_low(int n, const ld *u, int symmetric, ld *U)
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
ROLN_FN void t_congr(int mm, int n, const ld *A, const ld *B, const ld *C, ld *Y)
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
ROLN_FN void t_spectral(int kind, int n, const ld *X, ld *Y, ld *l)
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
ROLN_FN void t_mass(const ld *z, ld *X)
{
    ld u[4 * MAXN * MAXN], U[MAXN * MAXN], W[MAXN * MAXN], E[MAXN * MAXN];
    const roln_lnn *f = &m.f;
    const int w = f->n;
    int i, j, k;
    t_net(&f->mass_net, m.th, z, u);
    if (f->squares > 0) { /* L is all of u */
        for (i = 0; i < w * w; i++)
            for (X[i] = i % (w + 1) ? 0 : (ld)f->eigenvalue_floor, k = 0; k < f->squares; k++)
                X[i] += u[i / w * f->squares + k] * u[i % w * f->squares + k];
        return;
    }
    t_low(w, u, f->mass == ROLN_EXPONENTIAL, U);
    if (f->mass == ROLN_CHOLESKY) {
        for (i = 0; i < w * w; i++) W[i] = i % (w + 1) == 0;
        t_congr(w, w, U, W, U, X);
        for (i = 0; i < w; i++) X[i * (w + 1)] += (ld)f->eigenvalue_floor;
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
ROLN_FN ld t_width(void)
{
    return rolni_formed(&m.f) ? 3e-3L : 6e-3L;
}

/* The terms at one state: dM [k][n][n] = dM/dz_k and g = dV/dz by differences of order 8, C_ij = sum_k Gamma_ijk zd_k,
   kin_i = 1/2 sum_jk dM_jk/dz_i zd_j zd_k, d = L L^T zd + sum_j w_j |w_j . zd| w_j . zd + friction, w_j the columns of W. kink: the
   least |w_j . zd| and |g_j|, at which d has kinks. */
static struct {
    ld M[MAXN * MAXN], dM[MAXN * MAXN * MAXN], C[MAXN * MAXN], kin[MAXN], g[MAXN], d[MAXN], V, kink;
} tt;

/* Friction of coordinate i by its law, with the force g_i. */
ROLN_FN ld t_friction(int i, ld zd, ld g)
{
    const int n = m.f.n;
    const ld *law = m.th + friction_at + i;
    const ld c = expl(law[0]), v = expl(law[n]);
    ld level = c;
    if (drives(&m.f)) {
        const ld s = expl(law[2 * n]), w = expl(law[3 * n]), l = expl(law[4 * n]), a = tanhl(law[5 * n]), fall = coshl(zd / w);
        level = c * (1 + a * tanhl(zd / v)) + s / (fall * fall) + l * fabsl(g);
    }
    return level * tanhl(zd / v);
}

ROLN_FN void t_terms(const ld *z, const ld *zd)
{
    static const ld c[4] = {4.0L / 5, -1.0L / 5, 4.0L / 105, -1.0L / 280};
    const ld *pot = m.th + roln_mlp_params(&m.f.mass_net), h = t_width();
    ld x[MAXN], M[MAXN * MAXN], u[ROLN_TRI(MAXN) + MAXN * MAXN], L[MAXN * MAXN], V, y;
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
    for (tt.kink = 1, i = 0; m.f.friction > 0 && i < n; i++) {
        tt.d[i] = t_friction(i, zd[i], tt.g[i]);
        if (m.f.friction > 1 && fabsl(tt.g[i]) < tt.kink) tt.kink = fabsl(tt.g[i]);
    }
    if (!m.f.damping) return;
    t_net(&m.f.damper_net, m.th + damper_at, z, u);
    t_low(n, u, 0, L);
    for (j = 0; j < n; j++) {
        for (y = 0, i = 0; i < n; i++) y += L[i * n + j] * zd[i];
        for (i = 0; i < n; i++) tt.d[i] += L[i * n + j] * y;
    }
    for (j = 0; j < n && m.f.damping > 1; j++) {
        const ld *W = u + ROLN_TRI(n) + j;
        for (y = 0, i = 0; i < n; i++) y += W[i * n] * zd[i];
        for (i = 0; i < n; i++) tt.d[i] += W[i * n] * fabsl(y) * y;
        if (fabsl(y) < tt.kink) tt.kink = fabsl(y);
    }
}

/* y = A x [n][n] */
ROLN_FN void t_apply(const ld *A, const ld *x, ld *y)
{
    const int n = m.f.n;
    int i, j;
    for (i = 0; i < n; i++)
        for (y[i] = 0, j = 0; j < n; j++) y[i] += A[i * n + j] * x[j];
}

/* A force with 2n parameters: tau_i = w_i z_(i+1)^2 + w_(n+i) z_i */
#define FORCE(n, w, z, i) ((w)[i] * (z)[((i) + 1) % (n)] * (z)[((i) + 1) % (n)] + (w)[(n) + (i)] * (z)[i])

ROLN_FN ld t_tau(const ld *z, const ld *tau, int i)
{
    return m.force ? FORCE(m.f.n, m.w, z, i) : tau ? tau[i] : 0;
}

ROLN_FN void t_zdd(const ld *s, const ld *zd, const ld *tau, ld *zdd)
{
    ld c[MAXN];
    int i;
    t_terms(s, zd);
    t_apply(tt.C, zd, c);
    for (i = 0; i < m.f.n; i++) zdd[i] = t_tau(s, tau, i) - c[i] - tt.g[i] - tt.d[i];
    t_solve(m.f.n, 1, tt.M, zdd);
}

ROLN_FN void t_inverse(const ld *s, const ld *zd, const ld *zdd, const ld *w, ld *tau)
{
    ld c[MAXN];
    int i;
    t_terms(s, zd);
    t_apply(tt.C, w, c);
    t_apply(tt.M, zdd, tau);
    for (i = 0; i < m.f.n; i++) tau[i] += c[i] + tt.g[i] + tt.d[i];
}

/* s1 = [z1; zd1] from z0, z1: zd1 = M(z1)^-1 (M v + h/2 F) */
ROLN_FN void t_start(ld h, const ld *z0, const ld *z1, ld *s1)
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
ROLN_FN void t_step(int scheme, ld h, const ld *s, ld *sn)
{
    static const ld w[4] = {1.0L / 6, 1.0L / 3, 1.0L / 3, 1.0L / 6};
    const int n = m.f.n;
    ld k[2 * MAXN], x[2 * MAXN] = {0}, out[2 * MAXN], p[MAXN], pn[MAXN], v[MAXN], zm[MAXN];
    int i, j, it, settled = 0;
    if (scheme == ROLN_LEAPFROG) {
        for (i = 0; i < n; i++) x[i] = s[i] + h / 2 * s[n + i];
        memcpy(v, s + n, sizeof *v * (size_t)n);
        t_zdd(x, v, NULL, k);
        for (i = 0; i < n; i++) sn[n + i] = v[i] + h * k[i], sn[i] = x[i] + h / 2 * sn[n + i];
        return;
    }
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
        if (it > 0 && change < 1e-11L && ++settled == (EPS > 1e-10L ? 1 : 4)) break; /* v and p agree in the first round */
    }
    CHECK(it < 60);
    for (i = 0; i < n; i++) sn[i] = s[i] + h * v[i], sn[n + i] = pn[i];
    t_mass(sn, tt.M);
    t_solve(n, 1, tt.M, sn + n);
}

/* Maps with two planes of outputs [z; zd] rather than one. */
ROLN_FN int two_planes(void)
{
    return m.kind == START || (m.kind >= ROLN_EULER && m.kind <= ROLN_LEAPFROG);
}

/* The map m.kind of the block of m: [nb][n] or [2][nb][n]. */
ROLN_FN void t_run(ld *out)
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

ROLN_FN ld t_loss(void *ctx)
{
    ld out[2 * MAXB * MAXN], s = 0;
    int i;
    (void)ctx;
    t_run(out);
    for (i = 0; i < (two_planes() ? 2 : 1) * m.nb * m.f.n; i++) s += m.y[i] * out[i];
    return s;
}

/* Slopes of the loss in n inputs; parameters: along symmetric directions. */
ROLN_FN void t_slopes(int n, ld *x, ld *ref)
{
    int i;
    for (i = 0; i < n; i++) ref[i] = t_slope(t_loss, NULL, x + i, t_width());
}

static struct {
    int i, j;
    ld x0, move;
} param;
ROLN_FN ld t_loss_param(void *ctx)
{
    m.th[param.i] = m.th[param.j] = param.x0 + param.move;
    return t_loss(ctx);
}

ROLN_FN void t_slopes_params(ld *ref)
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

ROLN_FN void spring_eval(void *ctx, int nb, const roln_real *z, roln_real *tau)
{
    const spring *f = (const spring *)ctx;
    int i;
    for (i = 0; i < nb * f->n; i++) tau[i] = FORCE(f->n, f->w, z + i / f->n * f->n, i % f->n);
}

ROLN_FN void spring_bwd(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz)
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

ROLN_FN void spring_jac(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
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

ROLN_FN roln_lnn shape(int n, int base, int layers, int h1, int h2)
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
ROLN_FN roln_lnn behind(roln_lnn f, int layers)
{
    f.layers = layers;
    return f;
}

ROLN_FN roln_lnn cholesky(roln_lnn f)
{
    f.mass = ROLN_CHOLESKY, f.eigenvalue_floor = ROLN_C(0.1);
    return f;
}

/* M = L L^T + floor I with so many columns, all of whose entries are learned. */
ROLN_FN roln_lnn squares(roln_lnn f, int columns)
{
    f = cholesky(f);
    f.squares = columns, f.mass_net.size[f.mass_net.layers] = f.n * columns;
    return f;
}

/* Polynomials of these degrees in place of the networks of M and of V. */
ROLN_FN roln_lnn polynomial(roln_lnn f, int degree, int of_v)
{
    const int in = f.mass_net.size[0];
    f.mass_net.degree = f.damper_net.degree = degree, f.potential_net.degree = of_v;
    f.mass_net.size[1] = f.damper_net.size[1] = in + ROLN_MONOMIALS(in, degree);
    f.potential_net.size[1] = in + ROLN_MONOMIALS(in, of_v);
    return f;
}

ROLN_FN roln_lnn damped(roln_lnn f)
{
    f.damping = 1;
    return f;
}

ROLN_FN roln_lnn rubbing(roln_lnn f)
{
    f.friction = 1;
    return f;
}

/* Friction by the richer law. */
ROLN_FN roln_lnn grinding(roln_lnn f)
{
    f.friction = 2;
    return f;
}

/* Friction of f as impulses that can hold. */
ROLN_FN roln_lnn sticking(roln_lnn f)
{
    f.friction = -f.friction;
    return f;
}

/* Damping and quadratic drag. */
ROLN_FN roln_lnn dragged(roln_lnn f)
{
    f.damping = 2, f.damper_net.size[f.damper_net.layers] = ROLN_TRI(f.n) + f.n * f.n;
    return f;
}

/* Angles where `angles` has a bit; the networks have an input more for each. */
ROLN_FN roln_lnn turning(roln_lnn f, uint32_t angles)
{
    int i;
    f.angles = angles;
    for (i = 0; i < f.n; i++) f.mass_net.size[0] += (int)(angles >> i) & 1;
    f.potential_net.size[0] = f.damper_net.size[0] = f.mass_net.size[0];
    return f;
}

/* The shapes that all maps are tested on; small, since the twin differentiates in every parameter. */
/* From VARIANTS on those with angles, from TURNING on with friction, or both, from GROWING on of polynomials. */
enum { VARIANTS = 10, TURNING = 13, GROWING = 20, ALL = 24 };
ROLN_FN roln_lnn variant(int i)
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
    case 14: return rubbing(turning(damped(shape(2, 1, 2, 2, 0)), 1));
    case 15: return grinding(shape(2, 0, 2, 3, 0));
    case 16: return dragged(shape(2, 0, 2, 3, 0));
    case 17: return grinding(dragged(shape(1, 0, 2, 2, 0)));
    case 18: return grinding(turning(dragged(shape(2, 1, 3, 2, 2)), 2));
    case 19: return grinding(turning(behind(shape(3, 0, 2, 2, 0), 1), 3));
    case 20: return polynomial(squares(shape(2, 0, 2, 0, 0), 3), 3, 2);
    case 21: return polynomial(damped(shape(2, 1, 2, 0, 0)), 2, 3);
    case 22: return polynomial(damped(squares(turning(shape(2, 0, 2, 0, 0), 1), 2)), 2, 4);
    default: return grinding(polynomial(squares(turning(shape(2, 0, 2, 0, 0), 2), 3), 2, 3));
    }
}

/* A random SPD matrix around I, and its value after roln_lnn_init. */
ROLN_FN void random_spd(int n, roln_real *X, uint64_t *s)
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

/* Bit j: weights makes z_j ignorable. */
static unsigned cyclic;

/* Weights with biases, M well away from P, P and the layers random. */
ROLN_FN void set_weights(const roln_lnn *f, roln_real *th, uint64_t *s)
{
    /* v, w smooth enough for differences; Stribeck, load and asymmetry that count */
    static const roln_real more[6] = {0, 3, 3, 3, 2, ROLN_C(0.4)};
    const roln_mlp *net = &f->potential_net;
    roln_real *at = th + roln_mlp_params(&f->mass_net);
    const int n = f->n, from = net->degree > 0; /* the first layer with weights */
    int i, j;
    m.f = *f;
    layout(f);
    roln_lnn_init(f, th, s);
    for (i = 0; i < base_at; i++) th[i] = ROLN_C(0.9) * th[i] + ROLN_C(0.15) * roln_normal(s);
    for (i = friction_at; i < base_at; i++) th[i] += more[(i - friction_at) / n];
    for (i = from; drives(f) && i < net->layers; i++) { /* g is not 0 nearly everywhere: a path through V */
        const int to = from ? 1 : net->size[i + 1];
        for (j = 0; j < (i == from ? net->size[0] : 1); j++) at[j * to] = 2 + ROLN_ABS(at[j * to]);
        at += (net->size[i] + 1) * net->size[i + 1];
    }
    for (i = 0; i < n && f->damping > 1; i++) th[friction_at - n * n + i * (n + 1)] += ROLN_C(0.4);
    if (f->base) random_spd(n, th + base_at, s);
    for (i = 0; i < f->layers; i++) {
        roln_real *x = th + layer_at[i];
        for (j = 0; j < ROLN_TRI(n); j++) CHECK(x[j] == 1), x[j] += ROLN_C(0.2) * roln_normal(s);
        random_spd(n, x + ROLN_TRI(n), s);
    }
    for (j = 0; j < n; j++) {
        CHECK(!roln_lnn_ignores(f, j, th));
        if (cyclic >> j & 1) roln_lnn_ignore(f, j, th);
    }
    for (j = 0; j < n; j++) {
        const int step = f->mass_net.degree > 0 ? 1 : f->mass_net.size[1]; /* from the weights of an input to those of the next */
        roln_real *const seen[2] = {th + j * step, th + rolni_second_input(f, j) * step};
        CHECK(roln_lnn_ignores(f, j, th) == (int)(cyclic >> j & 1));
        for (i = 0; i < 2 && cyclic >> j & 1; i++) { /* a network that sees the cosine or the sine alone sees the angle */
            seen[i][0] = 1;
            CHECK(!roln_lnn_ignores(f, j, th));
            seen[i][0] = 0;
        }
    }
    widen(roln_lnn_params(f), th, m.th);
}

ROLN_FN roln_real *weights(const roln_lnn *f, uint64_t *s)
{
    roln_real *th = fresh(roln_lnn_params(f));
    set_weights(f, th, s);
    return th;
}

/* ---- maps ---- */

/* Inputs of a map, or their gradients. */
typedef struct {
    roln_real *th, *s, *a[2], *y, *w;
} inputs;

ROLN_FN int extras(void) /* inputs a[] */
{
    return m.kind == INVERSE_W ? 2 : m.kind == ZDD || m.kind == INVERSE ? 1 : 0;
}

ROLN_FN int directions(void)
{
    return m.kind == INVERSE_W ? 2 : 1;
}

ROLN_FN int stepping(void)
{
    return m.kind >= ROLN_EULER && m.kind <= ROLN_LEAPFROG;
}

/* Numbers on the tapes of the map. */
ROLN_FN int tape_of(int keep, int nb)
{
    const int tapes = !keep ? 1 : stepping() ? ROLN_STAGES(m.kind) : m.kind == START ? 2 : 1;
    return tapes * TAPE(directions(), keep, nb);
}

ROLN_FN int work_of(int keep, int nb)
{
    if (m.kind == ZDD) return ROLN_LNN_ZDD_WORK(SZ, keep, nb);
    if (m.kind == INVERSE || m.kind == INVERSE_W) return ROLN_LNN_INVERSE_WORK(SZ, directions(), keep, nb);
    if (m.kind == START) return ROLN_LNN_START_WORK(SZ, keep, nb);
    return ROLN_LNN_STEP_WORK(SZ, m.kind, keep, nb);
}

ROLN_FN int back_work_of(int nb)
{
    if (m.kind == ZDD) return ROLN_LNN_ZDD_BWD_WORK(SZ, nb);
    if (m.kind == INVERSE) return ROLN_LNN_INVERSE_BWD_WORK(SZ, nb);
    if (m.kind == START) return ROLN_LNN_START_BWD_WORK(SZ, nb);
    return ROLN_LNN_STEP_BWD_WORK(SZ, m.kind, nb);
}

/* The most that a forward function takes without a backward to follow. */
ROLN_FN int any_work(int nb)
{
    const int step = ROLN_MAX(ROLN_LNN_STEP_WORK(SZ, ROLN_RK4, 0, nb), ROLN_LNN_STEP_WORK(SZ, ROLN_MIDPOINT, 0, nb));
    const int inverse = ROLN_LNN_INVERSE_WORK(SZ, 2, 0, nb), start = ROLN_LNN_START_WORK(SZ, 0, nb);
    return ROLN_MAX(ROLN_MAX(step, inverse), ROLN_MAX(start, TERMS_WORK));
}

/* A system of the weights x->th under the force of the test, if m has one. */
ROLN_FN roln_system system_of(const inputs *x, roln_real *gw, spring *sp, roln_force *fc)
{
    roln_system sys;
    sp->n = m.f.n, sp->w = x->w, sp->gw = gw;
    fc->eval = spring_eval, fc->bwd = spring_bwd, fc->jac = spring_jac, fc->ctx = sp, fc->jac_zd = NULL;
    sys.theta = x->th, sys.force = m.force ? fc : NULL;
    return sys;
}

ROLN_FN roln_status run(const inputs *x, int keep, int nb, roln_real *out, roln_real *tape, roln_real *work)
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
ROLN_FN void back(const inputs *x, int nb, roln_real *tape, const inputs *g, roln_real *work)
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
ROLN_FN void arrays(inputs *x, roln_real ***at, int *length)
{
    const int k = m.nb * m.f.n;
    at[0] = &x->th, at[1] = &x->s, at[2] = x->a, at[3] = x->a + 1, at[4] = &x->w, at[5] = &x->y;
    length[0] = roln_lnn_params(&m.f), length[1] = 2 * k, length[4] = 2 * m.f.n, length[5] = (two_planes() ? 2 : 1) * k;
    length[2] = extras() > 0 ? k : 0, length[3] = extras() > 1 ? k : 0;
}

ROLN_FN inputs zero_inputs(void)
{
    inputs g;
    roln_real **at[ARRAYS];
    int len[ARRAYS], q;
    arrays(&g, at, len);
    for (q = 0; q < ARRAYS; q++) *at[q] = zeros(len[q]);
    return g;
}

ROLN_FN inputs copy_inputs(inputs x)
{
    inputs c;
    roln_real **to[ARRAYS], **from[ARRAYS];
    int len[ARRAYS], q;
    arrays(&c, to, len), arrays(&x, from, len);
    for (q = 0; q < ARRAYS; q++) *to[q] = copy(len[q], *from[q]);
    return c;
}

/* Row r of x. */
ROLN_FN void row_of(const inputs *x, int r, inputs *one)
{
    const int n = m.f.n;
    int q;
    memcpy(one->s, x->s + r * n, (size_t)n * sizeof *x->s);
    memcpy(one->s + n, x->s + (m.nb + r) * n, (size_t)n * sizeof *x->s);
    for (q = 0; q < extras(); q++) memcpy(one->a[q], x->a[q] + r * n, (size_t)n * sizeof *x->s);
}

/* The distance of row r of the states x [2][nb][n] of m from a kink of d. */
ROLN_FN ld t_kink(const roln_real *x, int r)
{
    const int n = m.f.n;
    ld z[MAXN], zd[MAXN];
    if (m.f.friction < 2 && m.f.damping < 2) return 1;
    widen(n, x + r * n, z), widen(n, x + (m.nb + r) * n, zd);
    t_terms(z, zd);
    return tt.kink;
}

/* Random inputs of the map for the weights th, in x and in m; away from kinks, where there are no differences. */
ROLN_FN inputs draw(const roln_lnn *f, roln_real *th, int kind, int nb, int force, uint64_t *seed)
{
    inputs x;
    int i, r, tries;
    const int k = nb * f->n;
    ld *wide[ARRAYS];
    roln_real **at[ARRAYS];
    int len[ARRAYS];
    m.kind = kind, m.nb = nb, m.force = force && kind != ZDD && kind != INVERSE && kind != INVERSE_W, m.h = (ld)ROLN_C(0.05);
    if (f->damping > 1 || drives(f)) /* y stays as it is; the midpoint rule settles */
        m.h = (ld)(kind == START ? ROLN_C(0.2) : ROLN_C(0.005));
    else if (f->mass_net.degree > 0 && kind == ROLN_MIDPOINT) m.h = (ld)ROLN_C(0.01);
    x.th = th, x.s = fresh(2 * k);
    for (i = 0; i < 2 * k; i++) x.s[i] = ROLN_C(0.8) * roln_normal(seed);
    for (i = 0; i < k && f->mass_net.degree > 0; i++) x.s[i] /= 2; /* polynomials are made for [-1, 1] */
    for (r = 0; r < nb; r++) {
        for (tries = 0; t_kink(x.s, r) < 0.12L && tries < 1000; tries++)
            for (i = 0; i < 2 * f->n; i++) x.s[(i / f->n * nb + r) * f->n + i % f->n] = ROLN_C(0.8) * roln_normal(seed);
        CHECK(tries < 1000);
    }
    for (i = 0; i < k && kind == START; i++) x.s[k + i] = x.s[i] + (roln_real)m.h * x.s[k + i];
    for (i = 0; i < 2; i++) x.a[i] = normal(k, 1, seed);
    x.y = normal(2 * k, 1, seed), x.w = normal(2 * f->n, 0.5, seed);
    arrays(&x, at, len);
    wide[0] = m.th, wide[1] = m.s, wide[2] = m.a[0], wide[3] = m.a[1], wide[4] = m.w, wide[5] = m.y;
    for (i = 0; i < ARRAYS; i++) widen(len[i], *at[i], wide[i]);
    return x;
}

/* The largest |a - b|. */
ROLN_FN ld apart(int n, const roln_real *a, const roln_real *b)
{
    ld d = 0;
    int i;
    for (i = 0; i < n; i++)
        if (!(fabsl((ld)a[i] - (ld)b[i]) <= d)) d = fabsl((ld)a[i] - (ld)b[i]);
    return d;
}

ROLN_FN ld largest(int n, const ld *x)
{
    ld top = 0;
    while (n--) top = ROLN_MAX(top, fabsl(x[n]));
    return top;
}

/* M, c, g, d, T, V lie one after the other; where term i begins. */
enum { NTERMS = 6 };
ROLN_FN int term_at(int i)
{
    const int n = m.f.n;
    return i == 0 ? 0 : i < 5 ? n * n + (i - 1) * n : n * n + 3 * n + i - 4;
}

ROLN_FN roln_status terms(const roln_real *th, const roln_real *s, int skip, roln_real *X, roln_real *tape, roln_real *w)
{
    roln_real *at[NTERMS];
    roln_dynamics_out out;
    int i;
    for (i = 0; i < NTERMS; i++) at[i] = i == skip ? NULL : X + term_at(i);
    out.M = at[0], out.c = at[1], out.g = at[2], out.d = at[3], out.T = at[4], out.V = at[5];
    return roln_lnn_dynamics(&m.f, th, s, &out, tape, w);
}

/* A bowl: V = sum softplus(3 z_i) + softplus(-3 z_i), one hidden layer; the mass network varies with z. */
ROLN_FN roln_real *bowl(const roln_lnn *f, uint64_t *seed)
{
    const int n = f->n, h = 2 * n, np = roln_mlp_params(&f->mass_net);
    roln_real *th = weights(f, seed), *W = th + np;
    int i, k;
    for (i = 0; i < roln_mlp_params(&f->potential_net); i++) W[i] = 0;
    for (i = 0; i < n; i++) W[i * h + i] = 3, W[i * h + n + i] = -3;
    for (k = 0; k < h; k++) W[n * h + h + k] = 1;
    for (i = friction_at - ROLN_TRI(n); f->damping && i < friction_at - ROLN_TRI(n) + n; i++) th[i] = ROLN_C(0.5);
    widen(roln_lnn_params(f), th, m.th);
    return th;
}

/* T + V at s. */
ROLN_FN double energy(const roln_lnn *f, const roln_real *th, const roln_real *s, roln_real *tape, roln_real *w)
{
    roln_dynamics_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    roln_real T = 0, V = 0;
    out.T = &T, out.V = &V;
    CHECK(roln_lnn_dynamics(f, th, s, &out, tape, w) == ROLN_OK);
    return (double)T + (double)V;
}

/* A constant force, ctx [nb * n]. */
ROLN_FN void const_eval(void *ctx, int nb, const roln_real *z, roln_real *tau)
{
    (void)z;
    memcpy(tau, ctx, sizeof *tau * (size_t)(nb * m.f.n));
}

#endif
