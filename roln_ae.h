/* roln_ae.h - constrained autoencoder: decoder phi and encoder rho with rho(phi(z)) = z by construction.

   Otto, Macchio, Rowley 2023, as used by Friedl et al., ICLR 2025. Layers l = 0 .. L-1 of sizes
   N = N_0 >= N_1 >= ... >= N_L = n; weights Phi_l, Psi_l in R^{N_l x N_{l+1}} with Psi_l^T Phi_l = I, bias b_l in R^{N_l}:

       encoder layer   a = Psi^T (x - b),  y = s-(a)          decoder layer   x = Phi s+(y) + b

   with s+ the inverse function of s-. Layers may keep their size (N_{l+1} = N_l): they bend without reducing [ours].
   Everything works on 1-, 2- or 3-jets: position, velocity, acceleration go
   through the layers together, no Jacobian and no Hessian is formed.

   1 shape and layout     2 activation     3 encode     4 decode     5 forces     6 initialisation
   7 weights stored as int8 or half-precision numbers

   A block of nb samples with `jets` planes is an array [jets][nb][dim]; jets = 1 positions, 2 with velocities,
   3 with accelerations. Forward functions write a tape that the backward of the same block reads. */

#ifndef ROLN_AE_H
#define ROLN_AE_H

#include "roln_spd.h"

/* ---- 1 shape and layout ----------------------------------------------------------------------- */

#define ROLN_AE_MAX 8 /* layers at most */

/* How the matrices lie in theta: as they are, ROLN_FULL, or small (section 7), and then how products read them. */
typedef struct {
    int bits; /* of a weight */
    void (*mm)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);    /* roln_mm */
    void (*mm_bt)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C); /* roln_mm_bt */
    roln_real (*column)(int k, int n, int j, const roln_real *a, const roln_real *B);         /* rolni_column */
} roln_storage;
#define ROLN_FULL NULL

/* The shape of an autoencoder: all that gives its weights their meaning. */
typedef struct {
    int layers;                /* L, 0 .. ROLN_AE_MAX; 0: no autoencoder, z = x */
    int size[ROLN_AE_MAX + 1]; /* N_0 >= N_1 >= ... >= N_L */
    roln_real slope;           /* k in (0,1], slope of the activation at +-infinity; 1 makes it the identity (POD) */
    const roln_storage *store; /* ROLN_FULL; &roln_half, &roln_int8: no gradient with respect to theta */
} roln_ae;

/* Numbers that a row of n weights takes, and a layer N -> n. */
#define ROLN_AE_ROW(bits, n) ((bits) == 8 ? 1 + ((n) + 7) / 8 * 2 : (bits) == 16 ? ((n) + 7) / 8 * 4 : (n))
#define ROLN_AE_LAYER(bits, N, n) \
    (2 * (n) * ROLN_AE_ROW(bits, N) + ((bits) > 0 ? (n) * ROLN_AE_ROW(bits, n) : 0) + (N))

ROLN_FN int rolni_ae_bits(const roln_ae *ae)
{
    return ae->store == ROLN_FULL ? 0 : ae->store->bits;
}

/* theta holds for l = 0 .. L-1: Phi_l^T [N_{l+1}][N_l], Psi_l^T [N_{l+1}][N_l], of stored weights D_l [N_{l+1}][N_{l+1}],
   and b_l [N_l]. Both transposed: the long side is contiguous. */
ROLN_FN int roln_ae_params(const roln_ae *ae)
{
    const int bits = rolni_ae_bits(ae);
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += ROLN_AE_LAYER(bits, ae->size[l], ae->size[l + 1]);
    return sum;
}

/* The parts of layer l, which begins at theta. */
typedef struct {
    const roln_real *phi, *psi, *d, *b, *end;
} rolni_part;

ROLN_FN rolni_part rolni_part_of(const roln_ae *ae, int l, const roln_real *theta)
{
    const int bits = rolni_ae_bits(ae), N = ae->size[l], n = ae->size[l + 1], matrix = n * ROLN_AE_ROW(bits, N);
    rolni_part w;
    w.phi = theta;
    w.psi = theta + matrix;
    w.d = w.psi + matrix;
    w.end = theta + ROLN_AE_LAYER(bits, N, n);
    w.b = w.end - N;
    return w;
}

/* The products with a matrix of a layer: C = A B, C = A B^T, and of C = a B one number, C[j]. */
ROLN_FN void rolni_ae_mm(const roln_ae *ae, int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    if (ae->store == ROLN_FULL) roln_mm(m, k, n, A, B, C);
    else ae->store->mm(m, k, n, A, B, C);
}

ROLN_FN void rolni_ae_mm_bt(const roln_ae *ae, int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    if (ae->store == ROLN_FULL) roln_mm_bt(m, k, n, A, B, C);
    else ae->store->mm_bt(m, k, n, A, B, C);
}

ROLN_FN roln_real rolni_column(int k, int n, int j, const roln_real *a, const roln_real *B)
{
    roln_real sum = 0;
    int p;
    for (p = 0; p < k; p++)
        sum += a[p] * B[p * n + j];
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
    roln_bits b, m;
    memcpy(&b, &x, sizeof b);
    m = b & (inf | (inf - 1));
    b = (m - big < inf - big + 1 ? big : m) | (b & ~(inf | (inf - 1)));
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
   Cost: jets * nb multiply-adds per weight of Psi (and D). */
ROLN_FN void roln_ae_encode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *x, roln_real *z,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    int l, i, r;
    if (ae->layers == 0) memcpy(z, x, (size_t)(jets * nb * ae->size[0]) * sizeof *z);
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], rows = jets * nb;
        const rolni_part w = rolni_part_of(ae, l, theta);
        roln_real *xb = tape, *a = tape + rows * N, *y = l + 1 < ae->layers ? a + rows * n : z;
        if (l == 0) memcpy(xb, x, (size_t)(rows * N) * sizeof *x);
        for (r = 0; r < nb; r++) /* only positions are shifted */
            for (i = 0; i < N; i++)
                xb[r * N + i] -= w.b[i];
        rolni_ae_mm_bt(ae, rows, N, n, xb, w.psi, a);
        if (ae->store != ROLN_FULL) { /* a += D a */
            rolni_ae_mm_bt(ae, rows, n, n, a, w.d, y);
            for (i = 0; i < rows * n; i++)
                a[i] += y[i];
        }
        rolni_act(&s, 1, jets, nb * n, a, y);
        theta = w.end;
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
        const roln_real *a = tp - rows * n, *xb = a - rows * N;
        const rolni_part w = rolni_part_of(ae, l, th -= ROLN_AE_LAYER(rolni_ae_bits(ae), N, n));
        rolni_act_bwd(&s, 1, jets, nb * n, a, g);
        if (gtheta) { /* gPsi^T += ga^T (x - b), gb -= Psi sum_r ga_r */
            roln_real *gb = gtheta + (w.b - theta);
            roln_mm_at(n, rows, N, g, xb, gtheta + (w.psi - theta));
            memcpy(sum, g, (size_t)n * sizeof *g);
            for (r = 1; r < nb; r++)
                for (i = 0; i < n; i++)
                    sum[i] += g[r * n + i];
            roln_mm(1, n, N, sum, w.psi, gpos);
            for (i = 0; i < N; i++)
                gb[i] -= gpos[i];
        }
        if (ae->store != ROLN_FULL) { /* ga += D^T ga */
            rolni_ae_mm(ae, rows, n, n, g, w.d, gn);
            for (i = 0; i < rows * n; i++)
                g[i] += gn[i];
        }
        if (l > 0 || gx) { /* gx = Psi ga */
            rolni_ae_mm(ae, rows, n, N, g, w.psi, gn);
            swap = g, g = gn, gn = swap;
        }
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
        const rolni_part w = rolni_part_of(ae, l, th -= ROLN_AE_LAYER(rolni_ae_bits(ae), N, n));
        roln_real *y = tape, *u = tape + rows * n, *out = l > 0 ? u + rows * n : x;
        if (l == ae->layers - 1) memcpy(y, z, (size_t)(rows * n) * sizeof *z);
        rolni_act(&s, -1, jets, nb * n, y, u);
        rolni_ae_mm(ae, rows, n, N, u, w.phi, out);
        for (r = 0; r < nb; r++)
            for (i = 0; i < N; i++)
                out[r * N + i] += w.b[i];
        tape = u + rows * n;
    }
}

/* ae without its first `skip` layers. */
ROLN_FN roln_ae rolni_ae_inner(const roln_ae *ae, int skip)
{
    roln_ae inner = *ae;
    inner.layers -= skip;
    memcpy(inner.size, ae->size + skip, (size_t)(inner.layers + 1) * sizeof *ae->size);
    return inner;
}

/* The coordinates which[0 .. count-1] of roln_ae_decode alone, the same bits: x [jets][nb][count]. Work as the tape of
   roln_ae_decode; it can not be read backward. Of the last layer it costs n multiply-adds a number instead of n N. */
ROLN_FN void roln_ae_decode_some(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *z, int count,
                                 const int *which, roln_real *x, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[1], rows = jets * nb;
    const rolni_knee s = rolni_knee_of(ae->slope);
    roln_real *y = work, *u = work + rows * n;
    rolni_part w;
    roln_ae inner;
    int i, r;
    if (ae->layers == 0) {
        for (i = 0; i < rows * count; i++)
            x[i] = z[i / count * N + which[i % count]];
        return;
    }
    w = rolni_part_of(ae, 0, theta);
    inner = rolni_ae_inner(ae, 1);
    roln_ae_decode(&inner, jets, nb, w.end, z, y, u);
    rolni_act(&s, -1, jets, nb * n, y, u);
    for (r = 0; r < rows; r++)
        for (i = 0; i < count; i++, x++) {
            *x = (ae->store == ROLN_FULL ? rolni_column : ae->store->column)(n, N, which[i], u + r * n, w.phi);
            if (r < nb) *x += w.b[which[i]];
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
        const roln_real *u = tp - rows * n, *y = u - rows * n;
        const rolni_part w = rolni_part_of(ae, l, theta);
        if (gtheta) { /* gPhi^T += u^T gx, gb += sum_r gx_r */
            roln_real *gb = gtheta + 2 * n * N;
            roln_mm_at(n, rows, N, u, g, gtheta);
            for (r = 0; r < nb; r++)
                for (i = 0; i < N; i++)
                    gb[i] += g[r * N + i];
            gtheta = gb + N;
        }
        rolni_ae_mm_bt(ae, rows, N, n, g, w.phi, gu); /* gu = Phi^T gx */
        rolni_act_bwd(&s, -1, jets, nb * n, y, gu);
        g = gu, gu = gn, gn = work + (g == work ? 0 : rows * ae->size[0]);
        theta = w.end;
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

/* The tape of roln_ae_encode at x = phi(z), as far as roln_ae_lift reads it, from that of roln_ae_decode at z: Psi^T Phi = I makes
   Psi^T (x - b) = s+(y). decoded: of jets planes; tape [roln_ae_tape(ae, 1, nb)] out. */
ROLN_FN void roln_ae_turn(const roln_ae *ae, int jets, int nb, const roln_real *decoded, roln_real *tape)
{
    int l;
    tape += roln_ae_tape(ae, 1, nb);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int m = nb * ae->size[l + 1];
        memcpy(tape - m, decoded + jets * m, (size_t)m * sizeof *tape);
        decoded += 2 * jets * m;
        tape -= m + nb * ae->size[l];
    }
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
   if some T has no full rank: theta is then half written, call again. ROLN_E_SHAPE: not ROLN_FULL; nothing is written. */
#define ROLN_AE_INIT_WORK(n) ((n) * (n) + (n)) /* Gram matrix and one column */
ROLN_FN roln_status roln_ae_init(const roln_ae *ae, roln_real *theta, uint64_t *seed, roln_real *work)
{
    int l, i, j;
    if (ae->store != ROLN_FULL) return ROLN_E_SHAPE;
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
   rank-n POD. theta out, untouched unless ROLN_OK; work [ROLN_AE_POD_WORK(N)]. Status of roln_eig; ROLN_E_SHAPE: not ROLN_FULL.
   Cost N^2 count + 9 N^3. */
#define ROLN_AE_POD_WORK(N) (2 * (N) * (N) + 3 * (N) + ROLN_EIG_WORK(N))
ROLN_FN roln_status roln_ae_init_pod(const roln_ae *ae, int count, const roln_real *x, roln_real scale,
                                     roln_real *theta, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[1];
    roln_real *cov = work, *Q = cov + N * N, *eval = Q + N * N, *mean = eval + N, *row = mean + N;
    const roln_real each = scale / (roln_real)count;
    roln_status st;
    int l, i, j;
    if (ae->store != ROLN_FULL) return ROLN_E_SHAPE;
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

/* ---- 7 stored weights ------------------------------------------------------------------------- */

/* Weights as they lie in flash to be small; arithmetic stays float. A row of n weights is
       roln_int8   a float s, then q_j = -127 .. 127, four to a word       w_j = s q_j, s = max |w| / 127
       roln_half   h_j, two to a word                                      w_j = h_j, IEEE binary16
   filled up with 0 to a multiple of eight entries; the first entry in the lowest bits of the first word, so that the order of
   bytes does not matter. Words lie among the numbers of theta and are only ever copied as bits: some look like NaN.
   Rounded Phi, Psi are no longer biorthogonal. What puts that right is (I + D) Psi^T for Psi^T, I + D = (Psi^T Phi)^-1, so that
   encoding a decoded state still gives it back, up to the rounding of D, which is small: no layer is stored that gives its
   input u back farther off than |u| / 100. Float only. */

/* Nonzero if number i of theta is a number, 0 if it is a word of weights. */
ROLN_FN int roln_ae_is_number(const roln_ae *ae, int i)
{
    const int bits = rolni_ae_bits(ae);
    int l, size = 0;
    for (l = 0; l < ae->layers && bits > 0 && i >= 0; l++, i -= size) {
        const int N = ae->size[l], n = ae->size[l + 1], row = ROLN_AE_ROW(bits, N), d = ROLN_AE_ROW(bits, n);
        size = ROLN_AE_LAYER(bits, N, n);
        if (i < 2 * n * row) return bits == 8 && i % row == 0;
        if (i < size - N) return bits == 8 && (i - 2 * n * row) % d == 0;
    }
    return 1;
}

#ifndef ROLN_DOUBLE

/* Eight entries from w on. Halves: sign and the other bits go to their places in a float, 2^112 puts the exponent right, and
   keeps the smallest halves, unless the processor takes denormal floats for 0. */
typedef struct {
    float v0, v1, v2, v3, v4, v5, v6, v7;
} rolni_eight;

ROLNI_INLINE uint32_t rolni_word(const float *w)
{
    uint32_t x;
    ROLNI_COPY(&x, w, sizeof x);
    return x;
}

ROLNI_INLINE float rolni_byte(uint32_t low8)
{
    return (float)(int8_t)(low8 & 255);
}

ROLNI_INLINE float rolni_half(uint32_t high16)
{
    return 5.192296858534828e33f * rolni_real((uint32_t)((int32_t)high16 >> 3) & UINT32_C(0x8fffe000));
}

ROLNI_INLINE rolni_eight rolni_unpack(int bits, const float *w)
{
    const uint32_t a = rolni_word(w), b = rolni_word(w + 1);
    rolni_eight x;
    if (bits == 8) {
        x.v0 = rolni_byte(a), x.v1 = rolni_byte(a >> 8), x.v2 = rolni_byte(a >> 16), x.v3 = rolni_byte(a >> 24);
        x.v4 = rolni_byte(b), x.v5 = rolni_byte(b >> 8), x.v6 = rolni_byte(b >> 16), x.v7 = rolni_byte(b >> 24);
    } else {
        const uint32_t c = rolni_word(w + 2), d = rolni_word(w + 3);
        x.v0 = rolni_half(a << 16), x.v1 = rolni_half(a), x.v2 = rolni_half(b << 16), x.v3 = rolni_half(b);
        x.v4 = rolni_half(c << 16), x.v5 = rolni_half(c), x.v6 = rolni_half(d << 16), x.v7 = rolni_half(d);
    }
    return x;
}

ROLNI_INLINE void rolni_put_eight(int most, const rolni_eight *x, float *c)
{
    if (most >= 8) memcpy(c, x, sizeof *x);
    else memcpy(c, x, (size_t)most * sizeof *c);
}

/* roln_mm, two rows of A at a time: sum_p (A[p] s_p) q_pj in order 1. */
ROLNI_INLINE void rolni_stored_mm(int bits, int two, int k, int n, const float *a, const float *B, float *c)
{
    const int row = ROLN_AE_ROW(bits, n);
    int j, p;
    for (j = 0; j < n; j += 8, c += 8) {
        const float *b = B + j * bits / 32;
        rolni_eight s = {0, 0, 0, 0, 0, 0, 0, 0}, t = s;
        for (p = 0; p < k; p++, b += row) {
            const rolni_eight w = rolni_unpack(bits, b + (bits == 8));
            const float f = bits == 8 ? a[p] * B[p * row] : a[p];
            s.v0 += f * w.v0, s.v1 += f * w.v1, s.v2 += f * w.v2, s.v3 += f * w.v3;
            s.v4 += f * w.v4, s.v5 += f * w.v5, s.v6 += f * w.v6, s.v7 += f * w.v7;
            if (two) {
                const float g = bits == 8 ? a[k + p] * B[p * row] : a[k + p];
                t.v0 += g * w.v0, t.v1 += g * w.v1, t.v2 += g * w.v2, t.v3 += g * w.v3;
                t.v4 += g * w.v4, t.v5 += g * w.v5, t.v6 += g * w.v6, t.v7 += g * w.v7;
            }
        }
        rolni_put_eight(n - j, &s, c);
        if (two) rolni_put_eight(n - j, &t, c + n);
    }
}

/* roln_mm_bt, two rows of A at a time: s_j sum_p A[p] q_jp in order 2. */
ROLNI_INLINE void rolni_stored_mm_bt(int bits, int two, int k, int n, const float *a, const float *B, float *c)
{
    const int row = ROLN_AE_ROW(bits, k);
    float last[16] = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}; /* the last eight of a row of A, filled up */
    int j, p;
    memcpy(last, a + k - k % 8, (size_t)(k % 8) * sizeof *a);
    if (two) memcpy(last + 8, a + 2 * k - k % 8, (size_t)(k % 8) * sizeof *a);
    for (j = 0; j < n; j++, B += row) {
        const float *b = B + (bits == 8), scale = bits == 8 ? B[0] : 1;
        rolni_eight s = {0, 0, 0, 0, 0, 0, 0, 0}, t = s;
        for (p = 0; p < k; p += 8, b += bits / 4) {
            const float *x = p + 8 <= k ? a + p : last, *y = p + 8 <= k ? a + k + p : last + 8;
            const rolni_eight w = rolni_unpack(bits, b);
            s.v0 += x[0] * w.v0, s.v1 += x[1] * w.v1, s.v2 += x[2] * w.v2, s.v3 += x[3] * w.v3;
            s.v4 += x[4] * w.v4, s.v5 += x[5] * w.v5, s.v6 += x[6] * w.v6, s.v7 += x[7] * w.v7;
            if (two) {
                t.v0 += y[0] * w.v0, t.v1 += y[1] * w.v1, t.v2 += y[2] * w.v2, t.v3 += y[3] * w.v3;
                t.v4 += y[4] * w.v4, t.v5 += y[5] * w.v5, t.v6 += y[6] * w.v6, t.v7 += y[7] * w.v7;
            }
        }
        c[j] = scale * (((s.v0 + s.v4) + (s.v2 + s.v6)) + ((s.v1 + s.v5) + (s.v3 + s.v7)));
        if (two) c[n + j] = scale * (((t.v0 + t.v4) + (t.v2 + t.v6)) + ((t.v1 + t.v5) + (t.v3 + t.v7)));
    }
}

/* rolni_column. */
ROLNI_INLINE float rolni_stored_column(int bits, int k, int n, int j, const float *a, const float *B)
{
    const int row = ROLN_AE_ROW(bits, n), at = j * bits % 32;
    const float *b = B + (bits == 8) + j * bits / 32;
    float sum = 0;
    int p;
    for (p = 0; p < k; p++, b += row)
        sum += bits == 8 ? a[p] * B[p * row] * rolni_byte(rolni_word(b) >> at) : a[p] * rolni_half(rolni_word(b) >> at << 16);
    return sum;
}

#define ROLNI_STORAGE(name, bits) \
    ROLN_FN void name##_mm(int m, int k, int n, const float *A, const float *B, float *C) \
    { \
        for (; m > 1; m -= 2, A += 2 * k, C += 2 * n) \
            rolni_stored_mm(bits, 1, k, n, A, B, C); \
        if (m > 0) rolni_stored_mm(bits, 0, k, n, A, B, C); \
    } \
    ROLN_FN void name##_mm_bt(int m, int k, int n, const float *A, const float *B, float *C) \
    { \
        for (; m > 1; m -= 2, A += 2 * k, C += 2 * n) \
            rolni_stored_mm_bt(bits, 1, k, n, A, B, C); \
        if (m > 0) rolni_stored_mm_bt(bits, 0, k, n, A, B, C); \
    } \
    ROLN_FN float name##_column(int k, int n, int j, const float *a, const float *B) \
    { \
        return rolni_stored_column(bits, k, n, j, a, B); \
    } \
    ROLNI_TABLE roln_storage name = {bits, name##_mm, name##_mm_bt, name##_column};
#if defined(__GNUC__)
#define ROLNI_TABLE static const __attribute__((unused))
#else
#define ROLNI_TABLE static const
#endif
ROLNI_STORAGE(roln_half, 16)
ROLNI_STORAGE(roln_int8, 8)
#undef ROLNI_STORAGE
#undef ROLNI_TABLE

/* x to the nearest half, to the even one of two; 0x7c00 and more: beyond the largest, 65504. Below 2^-14 halves are 2^-24 apart, as
   floats from 0.5 on are. */
ROLN_FN uint32_t rolni_half_of(float x)
{
    const uint32_t b = rolni_bits(x), a = b & ~ROLNI_SIGN, m = a - UINT32_C(0x38000000); /* 2^-112 |x| */
    return (b >> 16 & 0x8000) |
           (a < UINT32_C(0x38800000) ? rolni_bits(0.5f + rolni_real(a)) - UINT32_C(0x3f000000) : (m + 0xfff + (m >> 13 & 1)) >> 13);
}

/* Rows [rows][n] of x, stored. A row of int8 whose s would be denormal is 0. ROLN_E_NOT_FINITE; ROLN_E_RANGE: no half is so
   large. */
ROLN_FN roln_status rolni_store(int bits, int rows, int n, const float *x, float *out)
{
    if (!roln_all_finite(rows * n, x)) return ROLN_E_NOT_FINITE;
    for (; rows > 0; rows--, x += n) {
        uint32_t word = 0;
        float top = 0, s;
        int j;
        for (j = 0; j < n; j++)
            top = ROLN_ABS(x[j]) > top ? ROLN_ABS(x[j]) : top;
        if (bits == 16 && rolni_half_of(top) >= 0x7c00) return ROLN_E_RANGE;
        s = top / 127 >= 1.17549435e-38f ? top / 127 : 0;
        if (bits == 8) *out++ = s;
        for (j = 0; j < (n + 7) / 8 * 8; j++) {
            const float w = j < n ? x[j] : 0, q = s > 0 ? w / s : 0;
            const uint32_t entry = bits == 16 ? rolni_half_of(w) : (uint32_t)(int32_t)(q < 0 ? q - 0.5f : q + 0.5f) & 255;
            word |= entry << j * bits % 32;
            if ((j + 1) * bits % 32 > 0) continue;
            memcpy(out++, &word, sizeof word);
            word = 0;
        }
    }
    return ROLN_OK;
}

/* Rows [rows][n], as products read them. */
ROLN_FN void rolni_read(const roln_storage *store, int rows, int n, const float *from, float *x)
{
    const float one = 1;
    for (; rows > 0; rows--, from += ROLN_AE_ROW(store->bits, n), x += n)
        store->mm(1, 1, n, &one, from, x);
}

/* The decoder of a layer, x = W^T v with W = [b; Phi^T] [m][N], m = n + 1, and v = [1; s+(y)] from the layers behind it, is stored
   in three steps once those are. Plain rounding of Phi to int8 costs eight times as much on pend16, and Psi, which D corrects,
   next to nothing.

   1 What it gets: H = sum v v^T, G = sum v (v_full - v)^T [m][m] over states drawn from the box of z_min, z_max; v comes from
   the stored layers behind, `stored`, v_full from `full`. */
ROLN_FN void rolni_store_moments(const roln_ae *behind, const float *full, const float *stored, const float *z_min,
                                 const float *z_max, float *H, float *G, float *work)
{
    enum { DRAWS = 1024 };
    const int n = behind->size[0], nz = behind->size[behind->layers], m = n + 1;
    const rolni_knee s = rolni_knee_of(behind->slope);
    float *v = work, *off = v + m, *z = off + m, *y = z + nz, *tape = y + n; /* off = v_full - v */
    roln_ae plain = *behind;
    uint64_t seed = 1;
    int k, i;
    plain.store = ROLN_FULL;
    memset(H, 0, (size_t)(m * m) * sizeof *H);
    memset(G, 0, (size_t)(m * m) * sizeof *G);
    v[0] = 1, off[0] = 0;
    for (k = 0; k < DRAWS; k++) {
        for (i = 0; i < nz; i++)
            z[i] = z_min[i] + (z_max[i] - z_min[i]) * roln_uniform(&seed);
        roln_ae_decode(behind, 1, 1, stored, z, y, tape);
        rolni_act(&s, -1, 1, n, y, v + 1);
        roln_ae_decode(&plain, 1, 1, full, z, y, tape);
        rolni_act(&s, -1, 1, n, y, off + 1);
        for (i = 1; i < m; i++)
            off[i] -= v[i];
        roln_mm_at(m, 1, m, v, v, H);
        roln_mm_at(m, 1, m, v, off, G);
    }
}

/* 2 What it should do: sum |W^T v - W_full^T v_full|^2 + e |W - W_full|^2 is least at W = W_full + (H + e I)^-1 G W_full; e is a
   little of the mean of H_ii. W [m][N]: W_full in, W out; H in, L out, L L^T = H + e I; G is spent. work [m (N + 1)]. */
ROLN_FN roln_status rolni_store_fit(int m, int N, float *H, float *G, float *W, float *work)
{
    const float little = 1e-3f;
    float *change = work, *col = change + m * N, trace = 0;
    int i, j;
    for (i = 0; i < m; i++)
        trace += H[i * (m + 1)];
    for (i = 0; i < m; i++)
        H[i * (m + 1)] += little * trace / (float)m;
    if (roln_chol(m, H, H) != ROLN_OK) return ROLN_E_NOT_FINITE;
    for (j = 1; j < m; j++) { /* column 0 of G is 0 */
        for (i = 0; i < m; i++)
            col[i] = G[i * m + j];
        roln_solve_lower(m, H, col, col);
        roln_solve_lower_t(m, H, col, col);
        for (i = 0; i < m; i++)
            G[i * m + j] = col[i];
    }
    roln_mm(m, m, N, G, W, change);
    for (i = 0; i < m * N; i++)
        W[i] += change[i];
    return ROLN_OK;
}

/* 3 Rounding W to Q adds |L^T E|^2 = sum_p L_pp^2 |e_p + sum_{r>p} (L_rp / L_pp) e_r|^2, E = W - Q with rows e_p. From the last row
   to the first, w_p + sum_{r>p} .. is rounded to q_p, which makes good the errors behind it; row 0, b, need not be rounded
   (Babai 1986; Frantar et al. 2022 for networks). phi, b: where they are to lie. E [m][N] scratch. */
ROLN_FN roln_status rolni_store_rows(const roln_storage *store, int m, int N, const float *L, const float *W, float *phi, float *b,
                                     float *E)
{
    const int row = ROLN_AE_ROW(store->bits, N);
    int p, r, j;
    for (p = m - 1; p >= 0; p--) {
        const float *w = W + p * N;
        float *e = E + p * N, *q;
        roln_status st;
        memcpy(e, w, (size_t)N * sizeof *e);
        for (r = p + 1; r < m; r++)
            for (j = 0; j < N; j++)
                e[j] += L[r * m + p] / L[p * (m + 1)] * E[r * N + j];
        if (p == 0) break;
        q = phi + (p - 1) * row;
        if ((st = rolni_store(store->bits, 1, N, e, q)) != ROLN_OK) return st;
        rolni_read(store, 1, N, q, e);
        for (j = 0; j < N; j++)
            e[j] = w[j] - e[j];
    }
    memcpy(b, E, (size_t)N * sizeof *b);
    return roln_all_finite(N, b) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Phi and b of layer l; full, out: where the layer begins. */
ROLN_FN roln_status rolni_store_decoder(const roln_ae *ae, int l, const float *full, const float *z_min, const float *z_max,
                                        float *out, float *work)
{
    const int N = ae->size[l], n = ae->size[l + 1], m = n + 1;
    const roln_ae behind = rolni_ae_inner(ae, l + 1);
    float *H = work, *G = H + m * m, *W = G + m * m, *rest = W + m * N, *end = out + ROLN_AE_LAYER(ae->store->bits, N, n);
    roln_status st;
    rolni_store_moments(&behind, full + 2 * n * N + N, end, z_min, z_max, H, G, rest);
    memcpy(W, full + 2 * n * N, (size_t)N * sizeof *W);
    memcpy(W + N, full, (size_t)(n * N) * sizeof *W);
    if ((st = rolni_store_fit(m, N, H, G, W, rest)) != ROLN_OK) return st;
    return rolni_store_rows(ae->store, m, N, H, W, out, end - N, rest);
}

/* The autoencoder with weights `full` [roln_ae_params of ae with ROLN_FULL], stored as ae says: theta [roln_ae_params(ae)] out,
   untouched unless ROLN_OK. z_min, z_max [n]: where the decoder shall be good, NAME_fit_range. ROLN_E_NOT_FINITE; ROLN_E_RANGE: not
   z_min < z_max, or a weight that no half can hold; ROLN_E_ILL_CONDITIONED: what is left of the weights has no left inverse, or
   rounding D leaves it off by |(I + D) Psi^T Phi - I|_F > 1e-2. work [ROLN_AE_STORE_WORK], size: roln_ae_params(ae), N, n: N_0,
   N_1, aesum: roln_ae_tape(ae, 1, 1). */
#define ROLN_AE_STORE_WORK(size, N, n, aesum) ((size) + 2 * ((n) + 1) * ((N) + (n) + 3) + (aesum))
ROLN_FN roln_status roln_ae_store(const roln_ae *ae, const float *full, const float *z_min, const float *z_max, float *theta,
                                  float *work)
{
    const int size = roln_ae_params(ae), bits = rolni_ae_bits(ae), nz = ae->size[ae->layers];
    const float off = 1e-2f;
    float *out = work + size, *rest = out;
    int l, i;
    if (!roln_all_finite(nz, z_min) || !roln_all_finite(nz, z_max)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < nz; i++)
        if (!(z_min[i] < z_max[i])) return ROLN_E_RANGE;
    for (l = 0; l < ae->layers; l++)
        full += 2 * ae->size[l] * ae->size[l + 1] + ae->size[l];
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        float *psi, *D, *X = rest, *A = X + n * N, *C = A + n * n, *w = C + n * n;
        roln_status st;
        full -= 2 * n * N + N;
        out -= ROLN_AE_LAYER(bits, N, n), psi = out + n * ROLN_AE_ROW(bits, N), D = psi + n * ROLN_AE_ROW(bits, N);
        if ((st = rolni_store_decoder(ae, l, full, z_min, z_max, out, rest)) != ROLN_OK) return st;
        if ((st = rolni_store(bits, n, N, full + n * N, psi)) != ROLN_OK) return st;
        rolni_read(ae->store, n, N, psi, X);
        ae->store->mm_bt(n, N, n, X, out, A);
        if ((st = roln_inv(n, A, C, w)) != ROLN_OK) return st;
        for (i = 0; i < n; i++)
            C[i * (n + 1)] -= 1;
        if ((st = rolni_store(bits, n, n, C, D)) != ROLN_OK) return st;
        rolni_read(ae->store, n, n, D, C);
        roln_mm(n, n, n, C, A, X);
        for (i = 0; i < n * n; i++)
            X[i] += A[i] - (float)(i % (n + 1) == 0);
        if (!(roln_dot(n * n, X, X) <= off * off)) return ROLN_E_ILL_CONDITIONED;
    }
    memcpy(theta, work, (size_t)size * sizeof *theta);
    return ROLN_OK;
}

#endif

#endif
