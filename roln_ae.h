/* roln_ae.h - constrained autoencoder: decoder phi and encoder rho with rho(phi(z)) = z by construction.

   Otto, Macchio, Rowley 2023, as used by Friedl et al., ICLR 2025. Layers l = 0 .. L-1 of sizes
   N = N_0 >= N_1 >= ... >= N_L = n; weights Phi_l, Psi_l in R^{N_l x N_{l+1}} with Psi_l^T Phi_l = I, bias b_l in R^{N_l}:

       encoder layer   a = Psi^T (x - b),  y = s-(a)          decoder layer   x = Phi s+(y) + b

   with s+ the inverse function of s-. Layers may keep their size (N_{l+1} = N_l): they bend without reducing [ours].
   Everything works on 1-, 2- or 3-jets: position, velocity, acceleration go
   through the layers together, no Jacobian and no Hessian is formed.

   1 shape and layout     2 activation     3 encode     4 decode     5 forces     6 initialisation

   A block of nb samples with `jets` planes is an array [jets][nb][dim]; jets = 1 positions, 2 with velocities,
   3 with accelerations. Forward functions write a tape that the backward of the same block reads. */

#ifndef ROLN_AE_H
#define ROLN_AE_H

#include "roln_spd.h"

/* ---- 1 shape and layout ----------------------------------------------------------------------- */

#define ROLN_AE_MAX 8 /* layers at most */

/* The shape of an autoencoder: all that gives its weights their meaning. */
typedef struct {
    int layers;                /* L, 0 .. ROLN_AE_MAX; 0: no autoencoder, z = x */
    int size[ROLN_AE_MAX + 1]; /* N_0 >= N_1 >= ... >= N_L */
    roln_real slope;           /* k in (0,1], slope of the activation at +-infinity; 1 makes it the identity (POD) */
} roln_ae;

/* theta holds for l = 0 .. L-1: Phi_l^T [N_{l+1}][N_l], Psi_l^T [N_{l+1}][N_l], b_l [N_l]. Both transposed: the long
   side is contiguous. */
ROLN_FN int roln_ae_params(const roln_ae *ae)
{
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += 2 * ae->size[l] * ae->size[l + 1] + ae->size[l];
    return sum;
}

/* Numbers on the tape of a block of nb samples: of each layer its input and its output of every plane. */
ROLN_FN int roln_ae_tape(const roln_ae *ae, int jets, int nb)
{
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += ae->size[l] + ae->size[l + 1];
    return jets * nb * sum;
}

/* ---- 2 activation ----------------------------------------------------------------------------- */

/* Constants of the activation with slope k: s(x) = x [k1 - sg k2 (x + 2 sg c)/(R + r0)], R = sqrt((x + sg c)^2 + e),
   sg = +1 for s- (encoder), -1 for its inverse s+ (decoder). s(0) = 0, s'(0) = 1. The published form subtracts nearly
   equal numbers near 0, this one does not. */
typedef struct {
    roln_real k1, k2, c, r0, e;
} rolni_knee;

ROLN_FN rolni_knee rolni_knee_of(roln_real k)
{
    const roln_real q = 1 + k * k, w = ROLN_SQRT(q);
    rolni_knee s;
    s.k1 = q / (2 * k);
    s.k2 = (1 - k * k) / (2 * k);
    s.c = (1 - k) / (2 * w);
    s.r0 = (1 + k) / (2 * w);
    s.e = k / q;
    return s;
}

/* x limited to +-big, where s has long met its asymptote and x^2 does not overflow; NaN stays NaN. */
ROLN_FN roln_real rolni_limit(roln_real x)
{
#ifdef ROLN_DOUBLE
    const roln_bits big = UINT64_C(0x43abc16d674ec800), inf = UINT64_C(0x7ff0000000000000); /* 1e18 */
#else
    const roln_bits big = UINT32_C(0x4e6e6b28), inf = UINT32_C(0x7f800000); /* 1e9 */
#endif
    roln_bits b, m, over;
    memcpy(&b, &x, sizeof b);
    m = b & (inf | (inf - 1));
    over = (roln_bits)0 - (roln_bits)((m > big) & (m <= inf));
    b ^= (m ^ big) & over;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* y = s(a) of n numbers and, where jets > 1, yd = s' ad, ydd = s'' ad^2 + s' add: planes [jets][n] each. */
ROLN_FN void rolni_act(const rolni_knee *s, roln_real sg, int jets, int n, const roln_real *a, roln_real *ROLN_RESTRICT y)
{
    const roln_real k1 = s->k1, k2 = sg * s->k2, c = sg * s->c, r0 = s->r0, e = s->e;
    int i;
    for (i = 0; i < n && jets == 1; i++) {
        const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e);
        y[i] = a[i] * (k1 - k2 * (t + c) / (r + r0));
    }
    for (i = 0; i < n && jets >= 2; i++) {
        const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e);
        y[i] = a[i] * (k1 - k2 * (t + c) / (r + r0));
        y[n + i] = (k1 - k2 * t / r) * a[n + i];
    }
    for (i = 0; i < n && jets == 3; i++) {
        const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e), ad = a[n + i];
        y[2 * n + i] = (k1 - k2 * t / r) * a[2 * n + i] - k2 * e / (r * r * r) * ad * ad;
    }
}

/* Backward of rolni_act: g holds the cotangents of y, yd, ydd and receives those of a, ad, add. */
ROLN_FN void rolni_act_bwd(const rolni_knee *s, roln_real sg, int jets, int n, const roln_real *a, roln_real *g)
{
    const roln_real k1 = s->k1, k2 = sg * s->k2, c = sg * s->c, e = s->e;
    int i;
    if (jets == 1)
        for (i = 0; i < n; i++) {
            const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e);
            g[i] *= k1 - k2 * t / r;
        }
    if (jets == 2)
        for (i = 0; i < n; i++) {
            const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e), ir = 1 / r;
            const roln_real s1 = k1 - k2 * t * ir, s2 = -(k2 * e * ir * ir * ir), gd = g[n + i];
            g[i] = s1 * g[i] + s2 * a[n + i] * gd;
            g[n + i] = s1 * gd;
        }
    if (jets == 3)
        for (i = 0; i < n; i++) {
            const roln_real t = rolni_limit(a[i]) + c, r = ROLN_SQRT(t * t + e), ir = 1 / r;
            const roln_real s1 = k1 - k2 * t * ir, s2 = -(k2 * e * ir * ir * ir), s3 = -3 * s2 * t * ir * ir;
            const roln_real ad = a[n + i], add = a[2 * n + i], gd = g[n + i], gdd = g[2 * n + i];
            g[i] = s1 * g[i] + s2 * ad * gd + (s3 * ad * ad + s2 * add) * gdd;
            g[n + i] = s1 * gd + 2 * s2 * ad * gdd;
            g[2 * n + i] = s1 * gdd;
        }
}

/* ---- 3 encode --------------------------------------------------------------------------------- */

/* z = rho(x), zd = D xd, zdd = D xdd + (d/dt D) xd.
   theta [roln_ae_params], x [jets][nb][N] in; z [jets][nb][n], tape [roln_ae_tape(ae, jets, nb)] out.
   Cost: jets * nb multiply-adds per weight of Psi. */
ROLN_FN void roln_ae_encode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *x, roln_real *z,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    int l, i, r;
    if (ae->layers == 0) memcpy(z, x, (size_t)(jets * nb * ae->size[0]) * sizeof *z);
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], rows = jets * nb;
        const roln_real *psi = theta + n * N, *b = psi + n * N;
        roln_real *xb = tape, *a = tape + rows * N, *y = l + 1 < ae->layers ? a + rows * n : z;
        if (l == 0) memcpy(xb, x, (size_t)(rows * N) * sizeof *x);
        for (r = 0; r < nb; r++) /* only positions are shifted */
            for (i = 0; i < N; i++)
                xb[r * N + i] -= b[i];
        roln_mm_bt(rows, N, n, xb, psi, a);
        rolni_act(&s, 1, jets, nb * n, a, y);
        theta = b + N;
        tape = a + rows * n;
    }
}

/* Backward of roln_ae_encode. gz [jets][nb][n] in; adds to gx [jets][nb][N] and gtheta (each may be NULL).
   work [ROLN_AE_BWD_WORK(jets, nb, N)]. */
#define ROLN_AE_BWD_WORK(jets, nb, N) (2 * ((jets) * (nb) + 1) * (N)) /* two cotangents of the widest layer, two vectors */
ROLN_FN void roln_ae_encode_bwd(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                const roln_real *gz, roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb, wide = rows * ae->size[0];
    const roln_real *th = theta + roln_ae_params(ae), *tp = tape + roln_ae_tape(ae, jets, nb);
    roln_real *g = work, *gn = work + wide, *sum = gn + wide, *gpos = sum + ae->size[0], *swap;
    int l, i, r;
    memcpy(g, gz, (size_t)(rows * ae->size[ae->layers]) * sizeof *g);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const roln_real *b = th - N, *psi = b - n * N, *a = tp - rows * n, *xb = a - rows * N;
        rolni_act_bwd(&s, 1, jets, nb * n, a, g);
        if (gtheta) { /* gPsi^T += ga^T (x - b), gb -= Psi sum_r ga_r */
            roln_real *gb = gtheta + (b - theta);
            roln_mm_at(n, rows, N, g, xb, gtheta + (psi - theta));
            memcpy(sum, g, (size_t)n * sizeof *g);
            for (r = 1; r < nb; r++)
                for (i = 0; i < n; i++)
                    sum[i] += g[r * n + i];
            roln_mm(1, n, N, sum, psi, gpos);
            for (i = 0; i < N; i++)
                gb[i] -= gpos[i];
        }
        if (l > 0 || gx) { /* gx = Psi ga */
            roln_mm(rows, n, N, g, psi, gn);
            swap = g, g = gn, gn = swap;
        }
        th = psi - n * N;
        tp = xb;
    }
    for (i = 0; gx && i < wide; i++)
        gx[i] += g[i];
}

/* ---- 4 decode --------------------------------------------------------------------------------- */

/* x = phi(z), xd = J zd, xdd = J zdd + (d/dt J) zd.
   theta, z [jets][nb][n] in; x [jets][nb][N], tape [roln_ae_tape(ae, jets, nb)] out. Cost as roln_ae_encode. */
ROLN_FN void roln_ae_decode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *z, roln_real *x,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const roln_real *th = theta + roln_ae_params(ae);
    int l, i, r;
    if (ae->layers == 0) memcpy(x, z, (size_t)(jets * nb * ae->size[0]) * sizeof *x);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1], rows = jets * nb;
        const roln_real *b = th - N, *phi = b - 2 * n * N;
        roln_real *y = tape, *u = tape + rows * n, *out = l > 0 ? u + rows * n : x;
        if (l == ae->layers - 1) memcpy(y, z, (size_t)(rows * n) * sizeof *z);
        rolni_act(&s, -1, jets, nb * n, y, u);
        roln_mm(rows, n, N, u, phi, out);
        for (r = 0; r < nb; r++)
            for (i = 0; i < N; i++)
                out[r * N + i] += b[i];
        th = phi;
        tape = u + rows * n;
    }
}

/* Backward of roln_ae_decode. gx [jets][nb][N] in; adds to gz [jets][nb][n] and gtheta (each may be NULL).
   work [ROLN_AE_BWD_WORK(jets, nb, N)]. */
ROLN_FN void roln_ae_decode_bwd(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                const roln_real *gx, roln_real *gz, roln_real *gtheta, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb;
    const roln_real *g = gx, *tp = tape;
    roln_real *gu = work, *gn = work + rows * ae->size[0];
    int l, i, r;
    for (l = 0; l < ae->layers; l++)
        tp += 2 * rows * ae->size[l + 1];
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const roln_real *phi = theta, *u = tp - rows * n, *y = u - rows * n;
        if (gtheta) { /* gPhi^T += u^T gx, gb += sum_r gx_r */
            roln_real *gb = gtheta + 2 * n * N;
            roln_mm_at(n, rows, N, u, g, gtheta);
            for (r = 0; r < nb; r++)
                for (i = 0; i < N; i++)
                    gb[i] += g[r * N + i];
            gtheta = gb + N;
        }
        roln_mm_bt(rows, N, n, g, phi, gu); /* gu = Phi^T gx */
        rolni_act_bwd(&s, -1, jets, nb * n, y, gu);
        g = gu, gu = gn, gn = work + (g == work ? 0 : rows * ae->size[0]);
        theta += 2 * n * N + N;
        tp = y;
    }
    for (i = 0; gz && i < rows * ae->size[ae->layers]; i++)
        gz[i] += g[i];
}

/* ---- 5 forces --------------------------------------------------------------------------------- */

/* Both maps are vector-Jacobian products through a tape; with D taken at the decoded point phi(z), D J = I, so that
   reducing a lifted force gives it back exactly and no pseudo-inverse is needed. */

/* tau_z = J(z)^T tau. tape: of roln_ae_decode at z (jets = 1); tau [nb][N] in, tau_z [nb][n] out.
   work [ROLN_AE_BWD_WORK(1, nb, N)]. */
ROLN_FN void roln_ae_reduce(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *tape, const roln_real *tau,
                            roln_real *tau_z, roln_real *work)
{
    memset(tau_z, 0, (size_t)(nb * ae->size[ae->layers]) * sizeof *tau_z);
    roln_ae_decode_bwd(ae, 1, nb, theta, tape, tau, tau_z, NULL, work);
}

/* Backward of roln_ae_reduce at z [nb][n] with cotangent y [nb][n] of tau_z. Since y . J^T tau = tau . J y, it is the
   backward of the velocity of a decoded 1-jet (z, y). Adds to gz [nb][n], gtau [nb][N] = J y and gtheta (each may be
   NULL). work [ROLN_AE_REDUCE_BWD_WORK]. */
#define ROLN_AE_REDUCE_BWD_WORK(nb, N, n, tape2) \
    (4 * (nb) * (N) + 4 * (nb) * (n) + (tape2) + ROLN_AE_BWD_WORK(2, nb, N)) /* tape2 = roln_ae_tape(ae, 2, nb) */
ROLN_FN void roln_ae_reduce_bwd(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *z, const roln_real *tau,
                                const roln_real *y, roln_real *gz, roln_real *gtau, roln_real *gtheta, roln_real *work)
{
    const int N = nb * ae->size[0], n = nb * ae->size[ae->layers];
    roln_real *x = work, *gx = x + 2 * N, *jet = gx + 2 * N, *gjet = jet + 2 * n;
    roln_real *tape = gjet + 2 * n, *w = tape + roln_ae_tape(ae, 2, nb);
    int i;
    memcpy(jet, z, (size_t)n * sizeof *z);
    memcpy(jet + n, y, (size_t)n * sizeof *y);
    roln_ae_decode(ae, 2, nb, theta, jet, x, tape);
    for (i = 0; gtau && i < N; i++)
        gtau[i] += x[N + i];
    memset(gx, 0, (size_t)N * sizeof *gx);
    memcpy(gx + N, tau, (size_t)N * sizeof *tau);
    memset(gjet, 0, (size_t)(2 * n) * sizeof *gjet);
    roln_ae_decode_bwd(ae, 2, nb, theta, tape, gx, gjet, gtheta, w);
    for (i = 0; gz && i < n; i++)
        gz[i] += gjet[i];
}

/* tau = D(x)^T tau_z. tape: of roln_ae_encode at x (jets = 1), x = phi(z) for an exact lift; tau_z [nb][n] in,
   tau [nb][N] out. work [ROLN_AE_BWD_WORK(1, nb, N)]. */
ROLN_FN void roln_ae_lift(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *tape, const roln_real *tau_z,
                          roln_real *tau, roln_real *work)
{
    memset(tau, 0, (size_t)(nb * ae->size[0]) * sizeof *tau);
    roln_ae_encode_bwd(ae, 1, nb, theta, tape, tau_z, tau, NULL, work);
}

/* Backward of roln_ae_lift at x [nb][N] with cotangent y [nb][N] of tau: the backward of the velocity of an encoded
   1-jet (x, y). Adds to gx [nb][N], gtau_z [nb][n] = D y and gtheta (each may be NULL). work as roln_ae_reduce_bwd. */
ROLN_FN void roln_ae_lift_bwd(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *x, const roln_real *tau_z,
                              const roln_real *y, roln_real *gx, roln_real *gtau_z, roln_real *gtheta, roln_real *work)
{
    const int N = nb * ae->size[0], n = nb * ae->size[ae->layers];
    roln_real *jet = work, *gjet = jet + 2 * N, *z = gjet + 2 * N, *gz = z + 2 * n;
    roln_real *tape = gz + 2 * n, *w = tape + roln_ae_tape(ae, 2, nb);
    int i;
    memcpy(jet, x, (size_t)N * sizeof *x);
    memcpy(jet + N, y, (size_t)N * sizeof *y);
    roln_ae_encode(ae, 2, nb, theta, jet, z, tape);
    for (i = 0; gtau_z && i < n; i++)
        gtau_z[i] += z[n + i];
    memset(gz, 0, (size_t)n * sizeof *gz);
    memcpy(gz + n, tau_z, (size_t)n * sizeof *tau_z);
    memset(gjet, 0, (size_t)(2 * N) * sizeof *gjet);
    roln_ae_encode_bwd(ae, 2, nb, theta, tape, gz, gjet, gtheta, w);
    for (i = 0; gx && i < N; i++)
        gx[i] += gjet[i];
}

/* ---- 6 initialisation ------------------------------------------------------------------------- */

/* Random weights: T [n][N] xavier-normal of gain 0.99, Psi^T = T, Phi^T = (T T^T)^-1 T, b = 0, so Psi^T Phi = I; T = I
   where a layer keeps its size. theta out, seed in and out, work [ROLN_AE_INIT_WORK(N_1)]. ROLN_E_NOT_SPD, hardly ever,
   if some T has no full rank: theta is then half written, call again. */
#define ROLN_AE_INIT_WORK(n) ((n) * (n) + (n)) /* Gram matrix and one column */
ROLN_FN roln_status roln_ae_init(const roln_ae *ae, roln_real *theta, uint64_t *seed, roln_real *work)
{
    int l, i, j;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const roln_real sd = ROLN_C(0.99) * ROLN_SQRT(2 / (roln_real)(N + n));
        roln_real *phi = theta, *psi = theta + n * N, *b = psi + n * N, *G = work, *col = work + n * n;
        for (i = 0; i < n * N; i++)
            psi[i] = n < N ? sd * roln_normal(seed) : (roln_real)(i % (n + 1) == 0);
        roln_mm_bt(n, N, n, psi, psi, G);
        if (roln_chol(n, G, G) != ROLN_OK) return ROLN_E_NOT_SPD;
        for (j = 0; j < N; j++) {
            for (i = 0; i < n; i++)
                col[i] = psi[i * N + j];
            roln_solve_lower(n, G, col, col);
            roln_solve_lower_t(n, G, col, col);
            for (i = 0; i < n; i++)
                phi[i * N + j] = col[i];
        }
        memset(b, 0, (size_t)N * sizeof *b);
        theta = b + N;
    }
    return ROLN_OK;
}

/* Start at the linear optimum of the count samples scale * x [count][N]: b_0 = mean, Phi_0 = Psi_0 = the first N_1
   principal directions (POD), later layers Phi = Psi = [I; 0], b = 0. Since s+(s-(x)) = x the autoencoder then is the
   rank-n POD. theta out, untouched unless ROLN_OK; work [ROLN_AE_POD_WORK(N)]. Status of roln_eig. Cost N^2 count + 9 N^3. */
#define ROLN_AE_POD_WORK(N) (2 * (N) * (N) + 3 * (N) + ROLN_EIG_WORK(N))
ROLN_FN roln_status roln_ae_init_pod(const roln_ae *ae, int count, const roln_real *x, roln_real scale,
                                     roln_real *theta, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[1];
    roln_real *cov = work, *Q = cov + N * N, *eval = Q + N * N, *mean = eval + N, *row = mean + N;
    const roln_real each = scale / (roln_real)count;
    roln_status st;
    int l, i, j;
    if (ae->layers == 0) return ROLN_OK;
    memset(cov, 0, (size_t)(N * N) * sizeof *cov);
    memset(mean, 0, (size_t)N * sizeof *mean);
    for (i = 0; i < count; i++)
        for (j = 0; j < N; j++)
            mean[j] += each * x[(size_t)i * (size_t)N + (size_t)j];
    for (i = 0; i < count; i++) {
        for (j = 0; j < N; j++)
            row[j] = scale * x[(size_t)i * (size_t)N + (size_t)j] - mean[j];
        roln_mm_at(N, 1, N, row, row, cov);
    }
    st = roln_eig(N, cov, eval, Q, row + N);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) { /* the largest eigenvalue first */
        memcpy(theta + i * N, Q + (N - 1 - i) * N, (size_t)N * sizeof *Q);
        memcpy(theta + (n + i) * N, Q + (N - 1 - i) * N, (size_t)N * sizeof *Q);
    }
    memcpy(theta + 2 * n * N, mean, (size_t)N * sizeof *mean);
    theta += 2 * n * N + N;
    for (l = 1; l < ae->layers; l++) {
        const int M = ae->size[l], m = ae->size[l + 1];
        memset(theta, 0, (size_t)(2 * m * M + M) * sizeof *theta);
        for (i = 0; i < m; i++)
            theta[i * M + i] = theta[(m + i) * M + i] = 1;
        theta += 2 * m * M + M;
    }
    return ROLN_OK;
}

#endif
