/* roln_ae.h - constrained autoencoder: decoder phi and encoder rho with rho(phi(z)) = z by construction.

   Otto, Macchio, Rowley 2023, as used by Friedl et al., ICLR 2025. Layers l = 0 .. L-1 of sizes
   N = N_0 >= N_1 >= ... >= N_L = n; weights Phi_l, Psi_l in R^{N_l x N_{l+1}} with Psi_l^T Phi_l = I, bias b_l in R^{N_l}:

       encoder layer   a = Psi^T (x - b),  y = s-(a)          decoder layer   x = Phi u + b,  u = s+(y)

   with s+ the inverse function of s-. Beyond the paper, a layer may keep its size (N_{l+1} = N_l): it then bends its input without
   reducing it. Everything works on 1-, 2- or 3-jets: position, velocity and acceleration go through the layers together, and no
   Jacobian or Hessian is formed.

   1 shape and layout     sizes, the weights in theta, the tape of a block
   2 activation           s- and s+, value and backward
   3 encode               z = rho(x) and backward
   4 decode               x = phi(z) and backward, and single coordinates of x
   5 forces               tau_z = J^T tau and backward, tau = D^T tau_z
   6 initialisation       random, or principal directions of data
   7 stored weights       int8 or half-precision numbers in place of floats
   8 is it a left inverse?

   A block of nb samples with `jets` planes is an array [jets][nb][dim]; jets = 1: positions, 2: with velocities,
   3: with accelerations. Forward functions write a tape that the backward of the same block reads. */

#ifndef ROLN_AE_H
#define ROLN_AE_H

#include "roln_spd.h"

/* ---- 1 shape and layout ----------------------------------------------------------------------- */

#define ROLN_AE_MAX 8 /* layers at most */

/* How the matrices of an autoencoder lie in theta, and the products that read them there. ROLN_FULL: as they are. roln_half and
   roln_int8 (section 7): as 16- or 8-bit numbers. Each function of a storage computes what the one of its comment does, but takes
   B in that form; A and C are numbers. */
typedef struct {
    int bits;                                                                                 /* of a weight */
    void (*mm)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);    /* roln_mm */
    void (*mm_bt)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C); /* roln_mm_bt */
    roln_real (*column)(int k, int n, int j, const roln_real *a, const roln_real *B);         /* rolni_column */
} roln_storage;
#define ROLN_FULL NULL

/* The shape of an autoencoder: all that gives its weights their meaning. */
typedef struct {
    int layers;                  /* L, 0 .. ROLN_AE_MAX; 0: no autoencoder, z = x */
    int size[ROLN_AE_MAX + 1];   /* N_0 >= N_1 >= ... >= N_L */
    roln_real slope;             /* k in (0,1], slope of the activation at +-infinity; 1 makes it the identity (POD) */
    const roln_storage *storage; /* ROLN_FULL; &roln_half or &roln_int8: for use only, there is no gradient with respect to theta */
} roln_ae;

/* Size macros of this header take S, a macro that gives sizes of the shape by name. In a function it is ROLNI_LOCAL, and the
   sizes are local ints of these names; the typed shell of roln.h gives enum constants instead.
       S(N), S(n)     N_0, N_L
       S(N1), S(N2)   N_1, N_2; 0 where there is no such layer, so that S(N1) > 0 means that there are layers
       S(ae_sum)      N_1 + N_2 + .. + N_L
       S(ae_size)     roln_ae_params(ae) */

/* N_l, or 0 beyond the last layer. */
ROLN_FN int roln_ae_size(const roln_ae *ae, int l)
{
    return l <= ae->layers ? ae->size[l] : 0;
}

/* N_1 + N_2 + .. + N_L. */
ROLN_FN int roln_ae_sum(const roln_ae *ae)
{
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += ae->size[l + 1];
    return sum;
}

/* Numbers that a row of n weights takes, and a layer N -> n. */
#define ROLN_AE_ROW(bits, n) ((bits) == 8 ? 1 + ((n) + 7) / 8 * 2 : (bits) == 16 ? ((n) + 7) / 8 * 4 : (n))
#define ROLN_AE_LAYER(bits, N, n) \
    (2 * (n) * ROLN_AE_ROW(bits, N) + ((bits) > 0 ? (n) * ROLN_AE_ROW(bits, n) : 0) + (N))

/* Bits of a weight, 0 for ROLN_FULL. */
ROLN_FN int rolni_ae_bits(const roln_ae *ae)
{
    return ae->storage == ROLN_FULL ? 0 : ae->storage->bits;
}

/* theta holds for l = 0 .. L-1: Phi_l^T [N_{l+1}][N_l], Psi_l^T [N_{l+1}][N_l], of stored weights D_l [N_{l+1}][N_{l+1}],
   and b_l [N_l]. Both matrices are transposed, so that their long side is contiguous. */
ROLN_FN int roln_ae_params(const roln_ae *ae)
{
    const int bits = rolni_ae_bits(ae);
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += ROLN_AE_LAYER(bits, ae->size[l], ae->size[l + 1]);
    return sum;
}

/* The weights of layer l, which begin at theta; those of layer l + 1 begin at end. */
typedef struct {
    const roln_real *phi, *psi, *d, *b, *end;
} rolni_ae_layer;

ROLN_FN rolni_ae_layer rolni_ae_layer_at(const roln_ae *ae, int l, const roln_real *theta)
{
    const int bits = rolni_ae_bits(ae), N = ae->size[l], n = ae->size[l + 1], matrix = n * ROLN_AE_ROW(bits, N);
    rolni_ae_layer w;
    w.phi = theta;
    w.psi = theta + matrix;
    w.d = w.psi + matrix;
    w.end = theta + ROLN_AE_LAYER(bits, N, n);
    w.b = w.end - N;
    return w;
}

/* C = A B and C = A B^T with B a matrix of a layer, as it lies in theta. */
ROLN_FN void rolni_ae_mm(const roln_ae *ae, int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    if (ae->storage == ROLN_FULL) roln_mm(m, k, n, A, B, C);
    else ae->storage->mm(m, k, n, A, B, C);
}

ROLN_FN void rolni_ae_mm_bt(const roln_ae *ae, int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    if (ae->storage == ROLN_FULL) roln_mm_bt(m, k, n, A, B, C);
    else ae->storage->mm_bt(m, k, n, A, B, C);
}

/* One number of a B, sum_p a[p] B[p][j], with a [k] and B [k][n]: the same bits as roln_mm. */
ROLN_FN roln_real rolni_column(int k, int n, int j, const roln_real *a, const roln_real *B)
{
    roln_real sum = 0;
    int p;
    for (p = 0; p < k; p++)
        sum += a[p] * B[p * n + j];
    return sum;
}

ROLN_FN roln_real rolni_ae_column(const roln_ae *ae, int k, int n, int j, const roln_real *a, const roln_real *B)
{
    return (ae->storage == ROLN_FULL ? rolni_column : ae->storage->column)(k, n, j, a, B);
}

/* The tape of a block. Encoder and decoder write the same layout, for l = 0 .. L-1 both sides of the activation of the layer:
       inner side [jets][nb][N_{l+1}]   encoder: a = Psi^T (x - b)                     decoder: u = s+(y)
       outer side [jets][nb][N_{l+1}]   encoder: y - b_{l+1}, input of layer l + 1     decoder: y
   At the same point, x = phi(z), a and u are the same numbers up to rounding, since Psi^T Phi = I. The encoder leaves out the
   outer side of the last layer, which is z, and has x - b_0 [jets][nb][N] in its place. */
#define ROLN_AE_DECODE_TAPE(S, jets, nb) (2 * (jets) * (nb) * S(ae_sum))
#define ROLN_AE_ENCODE_REST(S, jets, nb) (S(N1) > 0 ? (jets) * (nb) * (2 * S(ae_sum) - S(n)) : 0) /* without x - b_0 */
#define ROLN_AE_ENCODE_TAPE(S, jets, nb) (S(N1) > 0 ? (jets) * (nb) * (2 * S(ae_sum) - S(n) + S(N)) : 0)

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
    const roln_bits b = rolni_bits(x), size = b & (inf | (inf - 1));
    return rolni_real((size - big < inf - big + 1 ? big : size) | (b & ~(inf | (inf - 1))));
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
   theta [roln_ae_params], x [jets][nb][N] in; z [jets][nb][n], tape [ROLN_AE_ENCODE_TAPE] out. x may stand in its place at the end
   of the tape, tape + ROLN_AE_ENCODE_REST: then it is not copied, and x - b_0 comes in its stead.
   Cost: jets * nb multiply-adds per weight of Psi (and D). */
ROLN_FN void roln_ae_encode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *x, roln_real *z,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb;
    roln_real *a = tape, *xb = tape + (ae->layers > 0 ? rows * (2 * roln_ae_sum(ae) - ae->size[ae->layers]) : 0);
    int l, i, r;
    if (ae->layers == 0) rolni_copy(rows * ae->size[0], x, z);
    else if (x != xb) memmove(xb, x, ROLNI_AS(size_t, rows * ae->size[0]) * sizeof *xb); /* gcc takes memcpy for an overlap */
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, theta);
        roln_real *y = l + 1 < ae->layers ? a + rows * n : z;
        for (r = 0; r < nb; r++) /* only positions are shifted */
            for (i = 0; i < N; i++)
                xb[r * N + i] -= w.b[i];
        rolni_ae_mm_bt(ae, rows, N, n, xb, w.psi, a);
        if (ae->storage != ROLN_FULL) { /* a += D a */
            rolni_ae_mm_bt(ae, rows, n, n, a, w.d, y);
            for (i = 0; i < rows * n; i++)
                a[i] += y[i];
        }
        rolni_act(&s, 1, jets, nb * n, a, y);
        theta = w.end;
        xb = y;
        a += 2 * rows * n;
    }
}

/* Sum of the rows of g [nb][n], in sum [n] or, of a single row, where it stands. */
ROLN_FN const roln_real *rolni_ae_total(int nb, int n, const roln_real *g, roln_real *sum)
{
    int r, i;
    if (nb == 1) return g;
    rolni_copy(n, g, sum);
    for (r = 1; r < nb; r++)
        for (i = 0; i < n; i++)
            sum[i] += g[r * n + i];
    return sum;
}

/* Backward of roln_ae_encode. gz [jets][nb][n] in; adds to gx [jets][nb][N] and gtheta (each may be NULL; gtheta must be, if
   weights are stored). work [ROLN_AE_ENCODE_BWD_WORK]: the cotangent of the N_l numbers between two layers stands in odd or even,
   as l is. */
#define ROLNI_AE_ENCODE_BWD_MEM(X, S, jets, nb) X(odd, (jets) * (nb) * S(N1)) X(even, S(N1) > 0 ? (jets) * (nb) * S(N) : 0)
#define ROLN_AE_ENCODE_BWD_WORK(S, jets, nb) (0 ROLNI_AE_ENCODE_BWD_MEM(ROLNI_SIZE, S, jets, nb))
ROLN_FN void roln_ae_encode_bwd(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                const roln_real *gz, roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb, L = ae->layers, N = ae->size[0], N1 = roln_ae_size(ae, 1);
    const roln_real *th = theta + roln_ae_params(ae), *a = tape + 2 * rows * roln_ae_sum(ae), *last = a - rows * ae->size[L];
    int l, i;
    ROLNI_AE_ENCODE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets, nb)
    if (L > 0) rolni_copy(rows * ae->size[L], gz, L % 2 ? odd : even);
    for (l = L - 1; l >= 0; l--) {
        const int Nl = ae->size[l], nl = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - ROLN_AE_LAYER(rolni_ae_bits(ae), Nl, nl));
        roln_real *g = l % 2 ? even : odd, *next = l % 2 ? odd : even;
        a -= 2 * rows * nl;
        rolni_act_bwd(&s, 1, jets, nb * nl, a, g);
        if (gtheta) { /* gPsi^T += ga^T (x - b), gb -= Psi sum_r ga_r */
            roln_real *gb = gtheta + (w.b - theta);
            roln_mm_at(nl, rows, Nl, g, l > 0 ? a - rows * Nl : last, gtheta + (w.psi - theta));
            roln_mm(1, nl, Nl, rolni_ae_total(nb, nl, g, next + Nl), w.psi, next);
            for (i = 0; i < Nl; i++)
                gb[i] -= next[i];
        }
        if (l == 0 && !gx) return;
        if (ae->storage != ROLN_FULL) { /* ga += D^T ga */
            rolni_ae_mm(ae, rows, nl, nl, g, w.d, next);
            for (i = 0; i < rows * nl; i++)
                g[i] += next[i];
        }
        rolni_ae_mm(ae, rows, nl, Nl, g, w.psi, next); /* gx = Psi ga */
        th = w.phi;
    }
    for (i = 0; gx && i < rows * N; i++)
        gx[i] += L > 0 ? even[i] : gz[i];
}

/* ---- 4 decode --------------------------------------------------------------------------------- */

/* x = phi(z), xd = J zd, xdd = J zdd + (d/dt J) zd.
   theta, z [jets][nb][n] in; x [jets][nb][N], tape [ROLN_AE_DECODE_TAPE] out. x NULL: the tape alone, without the product with
   Phi_0, which is the largest. z may stand in its place, the last jets nb n numbers of the tape: then it is not copied; it stays.
   Cost as roln_ae_encode. */
ROLN_FN void roln_ae_decode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *z, roln_real *x,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb;
    const roln_real *th = theta + roln_ae_params(ae);
    roln_real *u = tape + 2 * rows * roln_ae_sum(ae), *y = ae->layers > 0 ? u - rows * ae->size[ae->layers] : u;
    int l, i, r;
    if (ae->layers > 0 && z != y) rolni_copy(rows * ae->size[ae->layers], z, y);
    if (ae->layers == 0 && x) rolni_copy(rows * ae->size[0], z, x);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - ROLN_AE_LAYER(rolni_ae_bits(ae), N, n));
        u -= 2 * rows * n;
        rolni_act(&s, -1, jets, nb * n, y, u);
        y = l > 0 ? u - rows * N : x;
        if (!y) return;
        rolni_ae_mm(ae, rows, n, N, u, w.phi, y);
        for (r = 0; r < nb; r++)
            for (i = 0; i < N; i++)
                y[r * N + i] += w.b[i];
        th = w.phi;
    }
}

/* The cotangent of z [jets][nb][n] from that of x, gx, without adding it to anything: it stands in work [ROLN_AE_DECODE_BWD_WORK],
   or is gx itself if there are no layers. */
#define ROLNI_AE_DECODE_BWD_MEM(X, S, jets, nb) X(odd, (jets) * (nb) * S(N1)) X(even, (jets) * (nb) * S(N2))
#define ROLN_AE_DECODE_BWD_WORK(S, jets, nb) (0 ROLNI_AE_DECODE_BWD_MEM(ROLNI_SIZE, S, jets, nb))
ROLN_FN const roln_real *rolni_decode_back(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                           const roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb, N1 = roln_ae_size(ae, 1), N2 = roln_ae_size(ae, 2);
    const roln_real *g = gx;
    int l, i, r;
    ROLNI_AE_DECODE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets, nb)
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, theta);
        const roln_real *u = tape, *y = u + rows * n;
        roln_real *gu = l % 2 ? even : odd;
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
        g = gu;
        theta = w.end;
        tape = y + rows * n;
    }
    return g;
}

/* Backward of roln_ae_decode. gx [jets][nb][N] in; adds to gz [jets][nb][n] and gtheta (each may be NULL; gtheta must be, if
   weights are stored). work [ROLN_AE_DECODE_BWD_WORK]. */
ROLN_FN void roln_ae_decode_bwd(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                const roln_real *gx, roln_real *gz, roln_real *gtheta, roln_real *work)
{
    const roln_real *g = rolni_decode_back(ae, jets, nb, theta, tape, gx, gtheta, work);
    int i;
    for (i = 0; gz && i < jets * nb * ae->size[ae->layers]; i++)
        gz[i] += g[i];
}

/* The coordinates which[0 .. count-1] of roln_ae_decode alone, the same bits: which [count] of 0 .. N-1, z [jets][nb][n] in;
   x [jets][nb][count], tape [ROLN_AE_DECODE_TAPE] out, the same as of roln_ae_decode.
   Of the last layer it costs N_1 multiply-adds a number instead of N_1 N for all. */
ROLN_FN void roln_ae_decode_some(const roln_ae *ae, int jets, int nb, int count, const roln_real *theta, const int *which,
                                 const roln_real *z, roln_real *x, roln_real *tape)
{
    const int N = ae->size[0], rows = jets * nb;
    int r, i;
    roln_ae_decode(ae, jets, nb, theta, z, NULL, tape);
    for (r = 0; r < rows; r++)
        for (i = 0; i < count; i++, x++)
            if (ae->layers == 0) *x = z[r * N + which[i]];
            else {
                const rolni_ae_layer w = rolni_ae_layer_at(ae, 0, theta);
                *x = rolni_ae_column(ae, ae->size[1], N, which[i], tape + r * ae->size[1], w.phi);
                if (r < nb) *x += w.b[which[i]];
            }
}

/* ---- 5 forces --------------------------------------------------------------------------------- */

/* Both maps are vector-Jacobian products through a tape; with D taken at the decoded point phi(z), D J = I, so that
   reducing a lifted force gives it back exactly and no pseudo-inverse is needed. */

/* tau_z = J(z)^T tau. tape: of roln_ae_decode at z (jets = 1; its x is not needed); tau [nb][N] in, tau_z [nb][n] out.
   work [ROLN_AE_REDUCE_WORK]. */
#define ROLN_AE_REDUCE_WORK(S, nb) ROLN_AE_DECODE_BWD_WORK(S, 1, nb)
ROLN_FN void roln_ae_reduce(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *tape, const roln_real *tau,
                            roln_real *tau_z, roln_real *work)
{
    rolni_zero(nb * ae->size[ae->layers], tau_z);
    roln_ae_decode_bwd(ae, 1, nb, theta, tape, tau, tau_z, NULL, work);
}

/* Backward of roln_ae_reduce at z [nb][n] with cotangent y [nb][n] of tau_z. Since y . J^T tau = tau . J y, it is the
   backward of the velocity of a decoded 2-jet (z, y). Adds to gz [nb][n], gtau [nb][N] = J y and gtheta (each may be
   NULL; gtheta must be, if weights are stored). work [ROLN_AE_REDUCE_BWD_WORK]: jet is first the decoded 2-jet, then its
   cotangent; (z, y) stands at the end of the tape. */
#define ROLNI_AE_REDUCE_BWD_MEM(X, S, nb) \
    X(jet, S(N1) > 0 ? 2 * (nb) * S(N) : 0) X(tape, ROLN_AE_DECODE_TAPE(S, 2, nb))
#define ROLN_AE_REDUCE_BWD_WORK(S, nb) (0 ROLNI_AE_REDUCE_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_AE_DECODE_BWD_WORK(S, 2, nb))
ROLN_FN void roln_ae_reduce_bwd(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *z, const roln_real *tau,
                                const roln_real *y, roln_real *gz, roln_real *gtau, roln_real *gtheta, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[ae->layers], N1 = roln_ae_size(ae, 1), ae_sum = roln_ae_sum(ae);
    const roln_real *g;
    int i;
    ROLNI_AE_REDUCE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    roln_real *zy = work - 2 * nb * n;
    if (ae->layers == 0) { /* J = I */
        for (i = 0; gtau && i < nb * n; i++)
            gtau[i] += y[i];
        return;
    }
    rolni_copy(nb * n, z, zy);
    rolni_copy(nb * n, y, zy + nb * n);
    roln_ae_decode(ae, 2, nb, theta, zy, gtau ? jet : NULL, tape);
    for (i = 0; gtau && i < nb * N; i++)
        gtau[i] += jet[nb * N + i];
    rolni_zero(nb * N, jet);
    rolni_copy(nb * N, tau, jet + nb * N);
    g = rolni_decode_back(ae, 2, nb, theta, tape, jet, gtheta, work);
    for (i = 0; gz && i < nb * n; i++)
        gz[i] += g[i];
}

/* What roln_ae_lift needs of the tape of roln_ae_decode or roln_ae_encode at a point: the positions on the inner side of every
   layer, with which a lift at x = phi(z) need not encode x. tape: of jets planes; lift_tape [ROLN_AE_LIFT_TAPE] out, which may be
   the beginning of tape. */
#define ROLN_AE_LIFT_TAPE(S, nb) ((nb) * S(ae_sum))
ROLN_FN void roln_ae_lift_tape(const roln_ae *ae, int jets, int nb, const roln_real *tape, roln_real *lift_tape)
{
    int l;
    for (l = 0; l < ae->layers; l++) { /* in place nothing is overwritten: N_1 + .. + N_{l+1} <= 2 (N_1 + .. + N_l) */
        const int count = nb * ae->size[l + 1];
        if (lift_tape != tape) rolni_copy(count, tape, lift_tape);
        tape += 2 * jets * count;
        lift_tape += count;
    }
}

/* tau = D(x)^T tau_z. lift_tape: of roln_ae_lift_tape at x or, for an exact lift, at z with x = phi(z); tau_z [nb][n] in,
   tau [nb][N] out. work [ROLN_AE_LIFT_WORK]. It is roln_ae_encode_bwd with respect to x. */
#define ROLNI_AE_LIFT_MEM(X, S, nb) X(odd, (nb) * S(N1)) X(even, (nb) * S(N2))
#define ROLN_AE_LIFT_WORK(S, nb) (0 ROLNI_AE_LIFT_MEM(ROLNI_SIZE, S, nb))
ROLN_FN void roln_ae_lift(const roln_ae *ae, int nb, const roln_real *theta, const roln_real *lift_tape, const roln_real *tau_z,
                          roln_real *tau, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int L = ae->layers, N1 = roln_ae_size(ae, 1), N2 = roln_ae_size(ae, 2);
    const roln_real *th = theta + roln_ae_params(ae), *a = lift_tape + nb * roln_ae_sum(ae);
    int l, i;
    ROLNI_AE_LIFT_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    roln_real *first = L == 0 ? tau : L % 2 ? odd : even;
    for (i = 0; i < nb * ae->size[L]; i++)
        first[i] = 0 + tau_z[i]; /* 0 + makes -0 a 0 */
    for (l = L - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - ROLN_AE_LAYER(rolni_ae_bits(ae), N, n));
        roln_real *g = l % 2 ? even : odd, *next = l == 0 ? tau : l % 2 ? odd : even;
        a -= nb * n;
        rolni_act_bwd(&s, 1, 1, nb * n, a, g);
        if (ae->storage != ROLN_FULL) { /* ga += D^T ga */
            rolni_ae_mm(ae, nb, n, n, g, w.d, next);
            for (i = 0; i < nb * n; i++)
                g[i] += next[i];
        }
        rolni_ae_mm(ae, nb, n, N, g, w.psi, next); /* gx = Psi ga */
        th = w.phi;
    }
}

/* ---- 6 initialisation ------------------------------------------------------------------------- */

/* Random weights: T [n][N] xavier-normal of gain 0.99, Psi^T = T, Phi^T = (T T^T)^-1 T, b = 0, so Psi^T Phi = I; T = I
   where a layer keeps its size. theta out, seed in and out, work [ROLN_AE_INIT_WORK].
   ROLN_E_NOT_SPD: rows of some T are dependent to working precision, which has next to no probability; theta is then unusable, but
   seed has moved on, so that another call draws other numbers. ROLN_E_SHAPE: not ROLN_FULL; nothing is written. */
#define ROLNI_AE_INIT_MEM(X, S) X(G, S(N1) * S(N1)) X(col, S(N1)) /* Gram matrix, one column */
#define ROLN_AE_INIT_WORK(S) (0 ROLNI_AE_INIT_MEM(ROLNI_SIZE, S))
ROLN_FN roln_status roln_ae_init(const roln_ae *ae, roln_real *theta, uint64_t *seed, roln_real *work)
{
    const int N1 = roln_ae_size(ae, 1);
    int l, i, j;
    ROLNI_AE_INIT_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const roln_real sd = ROLN_C(0.99) * ROLN_SQRT(2 / ROLNI_AS(roln_real, N + n));
        roln_real *phi = theta, *psi = theta + n * N, *b = psi + n * N;
        for (i = 0; i < n * N; i++)
            psi[i] = n < N ? sd * roln_normal(seed) : ROLNI_AS(roln_real, i % (n + 1) == 0);
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
        rolni_zero(N, b);
        theta = b + N;
    }
    return ROLN_OK;
}

/* Start at the linear optimum of the count samples scale * x [count][N]: b_0 = mean, Phi_0 = Psi_0 = the first N_1
   principal directions (POD), later layers Phi = Psi = [I; 0], b = 0. Since s+(s-(x)) = x the autoencoder then is the
   rank-n POD. theta out, untouched unless ROLN_OK; work [ROLN_AE_POD_WORK]. Status of roln_eig; ROLN_E_SHAPE: not ROLN_FULL.
   Cost N^2 count + 9 N^3. */
#define ROLNI_AE_POD_MEM(X, S) \
    X(Q, S(N) * S(N)) /* covariance, then eigenvectors */ X(eval, S(N)) /* one sample, then eigenvalues */ X(mean, S(N))
#define ROLN_AE_POD_WORK(S) (S(N1) > 0 ? 0 ROLNI_AE_POD_MEM(ROLNI_SIZE, S) + ROLN_EIG_WORK(S(N)) : 0)
ROLN_FN roln_status roln_ae_init_pod(const roln_ae *ae, int count, const roln_real *x, roln_real scale,
                                     roln_real *theta, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[1];
    const roln_real each = scale / ROLNI_AS(roln_real, count);
    roln_status st;
    int l, i, j;
    ROLNI_AE_POD_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (ae->layers == 0) return ROLN_OK;
    rolni_zero(N * N, Q);
    rolni_zero(N, mean);
    for (i = 0; i < count; i++)
        for (j = 0; j < N; j++)
            mean[j] += each * x[ROLNI_AS(size_t, i) * ROLNI_AS(size_t, N) + ROLNI_AS(size_t, j)];
    for (i = 0; i < count; i++) {
        for (j = 0; j < N; j++)
            eval[j] = scale * x[ROLNI_AS(size_t, i) * ROLNI_AS(size_t, N) + ROLNI_AS(size_t, j)] - mean[j];
        roln_mm_at(N, 1, N, eval, eval, Q);
    }
    st = roln_eig(N, Q, eval, Q, work);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) { /* the largest eigenvalue comes first */
        rolni_copy(N, Q + (N - 1 - i) * N, theta + i * N);
        rolni_copy(N, Q + (N - 1 - i) * N, theta + (n + i) * N);
    }
    rolni_copy(N, mean, theta + 2 * n * N);
    theta += 2 * n * N + N;
    for (l = 1; l < ae->layers; l++) {
        const int Nl = ae->size[l], nl = ae->size[l + 1];
        rolni_zero(2 * nl * Nl + Nl, theta);
        for (i = 0; i < nl; i++)
            theta[i * Nl + i] = theta[(nl + i) * Nl + i] = 1;
        theta += 2 * nl * Nl + Nl;
    }
    return ROLN_OK;
}

/* ---- 7 stored weights ------------------------------------------------------------------------- */

/* Weights that take less flash; arithmetic stays float. A storage is how a matrix lies in theta, roln_storage; to store weights is
   to round them to one, roln_ae_store. A row of n weights is
       roln_int8   a float s, then q_j = -127 .. 127, four to a word       w_j = s q_j, s = max |w| / 127
       roln_half   h_j, two to a word                                      w_j = h_j, IEEE binary16
   filled up with 0 to a multiple of eight entries; the first entry is in the lowest bits of the first word, so that the order of
   bytes does not matter. Words stand among the numbers of theta and are only ever copied as bits: some look like NaN.
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

/* Eight neighbouring entries of a row. */
typedef struct {
    float v0, v1, v2, v3, v4, v5, v6, v7;
} rolni_eight;

ROLNI_INLINE uint32_t rolni_word(const float *w)
{
    uint32_t x;
    ROLNI_COPY(&x, w, sizeof x);
    return x;
}

/* The number that the lowest 8 bits are, as a signed integer. */
ROLNI_INLINE float rolni_from_int8(uint32_t low8)
{
    return ROLNI_AS(float, ROLNI_AS(int8_t, low8 & 255));
}

/* The number that the highest 16 bits are, as a half: sign and the other bits go to their places in a float, and 2^112 puts the
   exponent right. The smallest halves survive too, unless the processor takes denormal floats for 0. */
ROLNI_INLINE float rolni_from_half(uint32_t high16)
{
    return 5.192296858534828e33f * rolni_real(ROLNI_AS(uint32_t, ROLNI_AS(int32_t, high16) >> 3) & UINT32_C(0x8fffe000));
}

/* The eight entries that begin at word w. */
ROLNI_INLINE rolni_eight rolni_eight_at(int bits, const float *w)
{
    const uint32_t a = rolni_word(w), b = rolni_word(w + 1);
    rolni_eight x;
    if (bits == 8) {
        x.v0 = rolni_from_int8(a), x.v1 = rolni_from_int8(a >> 8), x.v2 = rolni_from_int8(a >> 16), x.v3 = rolni_from_int8(a >> 24);
        x.v4 = rolni_from_int8(b), x.v5 = rolni_from_int8(b >> 8), x.v6 = rolni_from_int8(b >> 16), x.v7 = rolni_from_int8(b >> 24);
    } else {
        const uint32_t c = rolni_word(w + 2), d = rolni_word(w + 3);
        x.v0 = rolni_from_half(a << 16), x.v1 = rolni_from_half(a), x.v2 = rolni_from_half(b << 16), x.v3 = rolni_from_half(b);
        x.v4 = rolni_from_half(c << 16), x.v5 = rolni_from_half(c), x.v6 = rolni_from_half(d << 16), x.v7 = rolni_from_half(d);
    }
    return x;
}

/* The first `most` of eight numbers, all if most is more. */
ROLNI_INLINE void rolni_put_eight(int most, const rolni_eight *x, float *c)
{
    if (most >= 8) memcpy(c, x, sizeof *x);
    else memcpy(c, x, ROLNI_AS(size_t, most) * sizeof *c);
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
            const rolni_eight w = rolni_eight_at(bits, b + (bits == 8));
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
    rolni_copy(k % 8, a + k - k % 8, last);
    if (two) rolni_copy(k % 8, a + 2 * k - k % 8, last + 8);
    for (j = 0; j < n; j++, B += row) {
        const float *b = B + (bits == 8), scale = bits == 8 ? B[0] : 1;
        rolni_eight s = {0, 0, 0, 0, 0, 0, 0, 0}, t = s;
        for (p = 0; p < k; p += 8, b += bits / 4) {
            const float *x = p + 8 <= k ? a + p : last, *y = p + 8 <= k ? a + k + p : last + 8;
            const rolni_eight w = rolni_eight_at(bits, b);
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

/* rolni_column: sum_p (a[p] s_p) q_pj in order 1. */
ROLNI_INLINE float rolni_stored_column(int bits, int k, int n, int j, const float *a, const float *B)
{
    const int row = ROLN_AE_ROW(bits, n), at = j * bits % 32;
    const float *b = B + (bits == 8) + j * bits / 32;
    float sum = 0;
    int p;
    for (p = 0; p < k; p++, b += row)
        sum += bits == 8 ? a[p] * B[p * row] * rolni_from_int8(rolni_word(b) >> at)
                         : a[p] * rolni_from_half(rolni_word(b) >> at << 16);
    return sum;
}

/* roln_half and roln_int8, with their functions. */
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

/* The half nearest to x, the even one of two; 0x7c00 or more if |x| is beyond the largest half, 65504. Below 2^-14 halves are 2^-24
   apart, as floats from 0.5 on are. */
ROLN_FN uint32_t rolni_to_half(float x)
{
    const uint32_t b = rolni_bits(x), size = b & ~ROLNI_SIGN, small = size - UINT32_C(0x38000000); /* 2^-112 |x| */
    return (b >> 16 & 0x8000) | (size < UINT32_C(0x38800000) ? rolni_bits(0.5f + rolni_real(size)) - UINT32_C(0x3f000000)
                                                             : (small + 0xfff + (small >> 13 & 1)) >> 13);
}

/* Rows [rows][n] of x, rounded to a storage of so many bits, into out. A row of int8 whose s would be denormal becomes 0.
   ROLN_E_NOT_FINITE; ROLN_E_RANGE: an entry is larger than the largest half. out is then unusable. */
ROLN_FN roln_status rolni_store_matrix(int bits, int rows, int n, const float *x, float *out)
{
    if (!roln_all_finite(rows * n, x)) return ROLN_E_NOT_FINITE;
    for (; rows > 0; rows--, x += n) {
        uint32_t word = 0;
        float top = 0, s;
        int j;
        for (j = 0; j < n; j++)
            top = ROLN_ABS(x[j]) > top ? ROLN_ABS(x[j]) : top;
        if (bits == 16 && rolni_to_half(top) >= 0x7c00) return ROLN_E_RANGE;
        s = top / 127 >= 1.17549435e-38f ? top / 127 : 0;
        if (bits == 8) *out++ = s;
        for (j = 0; j < (n + 7) / 8 * 8; j++) {
            const float w = j < n ? x[j] : 0, q = s > 0 ? w / s : 0;
            const int32_t nearest = ROLNI_AS(int32_t, bits == 16 ? 0 : q < 0 ? q - 0.5f : q + 0.5f);
            const uint32_t entry = bits == 16 ? rolni_to_half(w) : ROLNI_AS(uint32_t, nearest) & 255;
            word |= entry << j * bits % 32;
            if ((j + 1) * bits % 32 > 0) continue;
            memcpy(out++, &word, sizeof word);
            word = 0;
        }
    }
    return ROLN_OK;
}

/* Rows [rows][n] back to numbers, as products read them. */
ROLN_FN void rolni_read_matrix(const roln_storage *storage, int rows, int n, const float *from, float *x)
{
    const float one = 1;
    for (; rows > 0; rows--, from += ROLN_AE_ROW(storage->bits, n), x += n)
        storage->mm(1, 1, n, &one, from, x);
}

/* ae without its first `skip` layers. */
ROLN_FN roln_ae rolni_ae_inner(const roln_ae *ae, int skip)
{
    roln_ae inner = *ae;
    inner.layers -= skip;
    memcpy(inner.size, ae->size + skip, ROLNI_AS(size_t, inner.layers + 1) * sizeof *ae->size);
    return inner;
}

/* The decoder of a layer, x = W^T v with W = [b; Phi^T] [m][N], m = n + 1, and v = [1; s+(y)] from the layers behind it, is stored
   in three steps once those are. Plain rounding of Phi to int8 costs eight times as much on pend16, and Psi, which D corrects,
   next to nothing.

   1 What the layer gets: H = sum v v^T, G = sum v (v_full - v)^T [m][m] over states drawn from the box of z_min, z_max; v comes
   from the stored layers behind it, v_full from the full ones. part: the autoencoder from this layer on, whose weights begin at
   `stored` and `full`; of this layer itself none is read. */
#define ROLNI_STORE_MOMENTS_MEM(X, n, sum) X(v, (n) + 1) X(off, (n) + 1) X(tape, 2 * (sum)) /* off = v_full - v; sum: of part */
#define ROLNI_STORE_MOMENTS_WORK(n, sum) (0 ROLNI_STORE_MOMENTS_MEM(ROLNI_SIZE, n, sum))
ROLN_FN void rolni_store_moments(const roln_ae *part, const float *full, const float *stored, const float *z_min,
                                 const float *z_max, float *H, float *G, float *work)
{
    enum { ROLNI_DRAWS = 1024 };
    const int n = part->size[1], m = n + 1, nz = part->size[part->layers];
    roln_ae plain = *part;
    uint64_t seed = 1;
    int k, i;
    ROLNI_STORE_MOMENTS_MEM(ROLNI_CARVE, n, roln_ae_sum(part))
    float *z = work - nz; /* in its place on the tape */
    plain.storage = ROLN_FULL;
    rolni_zero(m * m, H);
    rolni_zero(m * m, G);
    v[0] = 1, off[0] = 0;
    for (k = 0; k < ROLNI_DRAWS; k++) {
        for (i = 0; i < nz; i++)
            z[i] = z_min[i] + (z_max[i] - z_min[i]) * roln_uniform(&seed);
        roln_ae_decode(part, 1, 1, stored, z, NULL, tape);
        rolni_copy(n, tape, v + 1);
        roln_ae_decode(&plain, 1, 1, full, z, NULL, tape);
        for (i = 1; i < m; i++)
            off[i] = tape[i - 1] - v[i];
        roln_mm_at(m, 1, m, v, v, H);
        roln_mm_at(m, 1, m, v, off, G);
    }
}

/* 2 What it should do: sum |W^T v - W_full^T v_full|^2 + e |W - W_full|^2 is least at W = W_full + (H + e I)^-1 G W_full; e is a
   little of the mean of H_ii. W [m][N]: W_full in, W out; H in, L out, L L^T = H + e I; G is spent. */
#define ROLNI_STORE_FIT_MEM(X, m, N) X(change, (m) * (N)) X(col, m)
#define ROLNI_STORE_FIT_WORK(m, N) (0 ROLNI_STORE_FIT_MEM(ROLNI_SIZE, m, N))
ROLN_FN roln_status rolni_store_fit(int m, int N, float *H, float *G, float *W, float *work)
{
    const float little = 1e-3f;
    float trace = 0;
    int i, j;
    ROLNI_STORE_FIT_MEM(ROLNI_CARVE, m, N)
    for (i = 0; i < m; i++)
        trace += H[i * (m + 1)];
    for (i = 0; i < m; i++)
        H[i * (m + 1)] += little * trace / ROLNI_AS(float, m);
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
ROLN_FN roln_status rolni_store_rows(const roln_storage *storage, int m, int N, const float *L, const float *W, float *phi,
                                     float *b, float *E)
{
    const int row = ROLN_AE_ROW(storage->bits, N);
    int p, r, j;
    for (p = m - 1; p >= 0; p--) {
        const float *w = W + p * N;
        float *e = E + p * N, *q;
        roln_status st;
        rolni_copy(N, w, e);
        for (r = p + 1; r < m; r++)
            for (j = 0; j < N; j++)
                e[j] += L[r * m + p] / L[p * (m + 1)] * E[r * N + j];
        if (p == 0) break;
        q = phi + (p - 1) * row;
        if ((st = rolni_store_matrix(storage->bits, 1, N, e, q)) != ROLN_OK) return st;
        rolni_read_matrix(storage, 1, N, q, e);
        for (j = 0; j < N; j++)
            e[j] = w[j] - e[j];
    }
    rolni_copy(N, E, b);
    return roln_all_finite(N, b) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Phi and b of layer l by the three steps; full, out: where the layer begins; the layers behind it are stored.
   sum: N_{l+1} + .. + N_L. */
#define ROLNI_STORE_DECODER_MEM(X, N, n) X(H, ((n) + 1) * ((n) + 1)) X(G, ((n) + 1) * ((n) + 1)) X(W, ((n) + 1) * (N))
#define ROLNI_STORE_DECODER_WORK(N, n, sum) \
    (0 ROLNI_STORE_DECODER_MEM(ROLNI_SIZE, N, n) + ROLN_MAX(ROLNI_STORE_MOMENTS_WORK(n, sum), ROLNI_STORE_FIT_WORK((n) + 1, N)))
ROLN_FN roln_status rolni_store_decoder(const roln_ae *ae, int l, const float *full, const float *z_min, const float *z_max,
                                        float *out, float *work)
{
    const int N = ae->size[l], n = ae->size[l + 1], m = n + 1;
    const roln_ae part = rolni_ae_inner(ae, l);
    float *b = out + ROLN_AE_LAYER(ae->storage->bits, N, n) - N;
    roln_status st;
    ROLNI_STORE_DECODER_MEM(ROLNI_CARVE, N, n)
    rolni_store_moments(&part, full, out, z_min, z_max, H, G, work);
    rolni_copy(N, full + 2 * n * N, W);
    rolni_copy(n * N, full, W + N);
    if ((st = rolni_store_fit(m, N, H, G, W, work)) != ROLN_OK) return st;
    return rolni_store_rows(ae->storage, m, N, H, W, out, b, work);
}

/* Psi and D of a layer N -> n whose Phi is stored at out, where the layer begins; psi_full: Psi^T as numbers. */
#define ROLNI_STORE_ENCODER_MEM(X, N, n) X(R, (n) * (N)) X(A, (n) * (n)) X(C, (n) * (n))
#define ROLNI_STORE_ENCODER_WORK(N, n) (0 ROLNI_STORE_ENCODER_MEM(ROLNI_SIZE, N, n) + ROLN_INV_WORK(n))
ROLN_FN roln_status rolni_store_encoder(const roln_storage *storage, int N, int n, const float *psi_full, float *out, float *work)
{
    const int matrix = n * ROLN_AE_ROW(storage->bits, N);
    const float most = 1e-2f;
    float *psi = out + matrix, *D = psi + matrix;
    roln_status st;
    int i;
    ROLNI_STORE_ENCODER_MEM(ROLNI_CARVE, N, n)
    if ((st = rolni_store_matrix(storage->bits, n, N, psi_full, psi)) != ROLN_OK) return st;
    rolni_read_matrix(storage, n, N, psi, R);
    storage->mm_bt(n, N, n, R, out, A); /* A = Psi^T Phi */
    if ((st = roln_inv(n, A, C, work)) != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        C[i * (n + 1)] -= 1;
    if ((st = rolni_store_matrix(storage->bits, n, n, C, D)) != ROLN_OK) return st;
    rolni_read_matrix(storage, n, n, D, C);
    roln_mm(n, n, n, C, A, R);
    for (i = 0; i < n * n; i++) /* R = (I + D) Psi^T Phi - I */
        R[i] += A[i] - ROLNI_AS(float, i % (n + 1) == 0);
    return roln_dot(n * n, R, R) <= most * most ? ROLN_OK : ROLN_E_ILL_CONDITIONED;
}

/* The autoencoder with weights `full` [roln_ae_params of ae with ROLN_FULL], stored as ae says: theta [roln_ae_params(ae)] out,
   untouched unless ROLN_OK. z_min, z_max [n]: where the decoder shall be good, NAME_fit_range. ROLN_E_NOT_FINITE; ROLN_E_RANGE: not
   z_min < z_max, or a weight that no half can hold; ROLN_E_ILL_CONDITIONED: what is left of the weights has no left inverse, or
   rounding D leaves it off by |(I + D) Psi^T Phi - I|_F > 1e-2. work [ROLN_AE_STORE_WORK]: out is theta to be, and the outermost
   layer takes the most. */
#define ROLNI_AE_STORE_MEM(X, S) X(out, S(ae_size))
#define ROLN_AE_STORE_WORK(S) \
    (S(N1) > 0 ? 0 ROLNI_AE_STORE_MEM(ROLNI_SIZE, S) + \
                     ROLN_MAX(ROLNI_STORE_DECODER_WORK(S(N), S(N1), S(ae_sum)), ROLNI_STORE_ENCODER_WORK(S(N), S(N1))) \
               : 0)
ROLN_FN roln_status roln_ae_store(const roln_ae *ae, const float *full, const float *z_min, const float *z_max, float *theta,
                                  float *work)
{
    const int ae_size = roln_ae_params(ae), bits = rolni_ae_bits(ae), nz = ae->size[ae->layers];
    roln_status st = ROLN_OK;
    int at = ae_size, l, i;
    ROLNI_AE_STORE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (!roln_all_finite(nz, z_min) || !roln_all_finite(nz, z_max)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < nz; i++)
        if (!(z_min[i] < z_max[i])) return ROLN_E_RANGE;
    for (l = 0; l < ae->layers; l++)
        full += ROLN_AE_LAYER(0, ae->size[l], ae->size[l + 1]);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        full -= ROLN_AE_LAYER(0, N, n);
        at -= ROLN_AE_LAYER(bits, N, n);
        st = rolni_store_decoder(ae, l, full, z_min, z_max, out + at, work);
        if (st == ROLN_OK) st = rolni_store_encoder(ae->storage, N, n, full + n * N, out + at, work);
        if (st != ROLN_OK) return st;
    }
    rolni_copy(ae_size, out, theta);
    return ROLN_OK;
}

#endif

/* ---- 8 is it a left inverse? ------------------------------------------------------------------ */

#define ROLN_AE_OFF ROLN_C(1.01e-2)

/* The weights need not lie in an array, so that a file can be looked at before it is taken: the bits of number i of theta. */
typedef roln_bits (*rolni_ae_read)(const void *theta, int i);

/* Weight p of the row that begins at number `row`. */
ROLN_FN roln_real rolni_ae_weight(int bits, rolni_ae_read read, const void *theta, int row, int p)
{
#ifndef ROLN_DOUBLE
    if (bits == 8) return rolni_real(read(theta, row)) * rolni_from_int8(read(theta, row + 1 + p / 4) >> p % 4 * 8);
    if (bits == 16) return rolni_from_half(read(theta, row + p / 2) >> p % 2 * 16 << 16);
#endif
    (void)bits;
    return rolni_real(read(theta, row + p));
}

/* Entries i, j0 .. j0 + count - 1 of (I + D) Psi^T Phi - I of a layer N -> n, whose Phi begins at number `at`, into e [count]. */
ROLN_FN void rolni_ae_off(int bits, rolni_ae_read read, const void *theta, int at, int N, int n, int i, int j0, int count,
                          roln_real *e)
{
    const int row = ROLN_AE_ROW(bits, N), psi = at + n * row, D = psi + n * row + i * ROLN_AE_ROW(bits, n);
    int p, k, j;
    for (j = 0; j < count; j++)
        e[j] = ROLNI_AS(roln_real, i == j0 + j ? -1 : 0);
    for (p = 0; p < N; p++) {
        roln_real x = rolni_ae_weight(bits, read, theta, psi + i * row, p);
        for (k = 0; k < n && bits > 0; k++)
            x += rolni_ae_weight(bits, read, theta, D, k) * rolni_ae_weight(bits, read, theta, psi + k * row, p);
        for (j = 0; j < count; j++)
            e[j] += x * rolni_ae_weight(bits, read, theta, at + (j0 + j) * row, p);
    }
}

ROLN_FN roln_status rolni_ae_check(const roln_ae *ae, rolni_ae_read read, const void *theta)
{
    const int bits = rolni_ae_bits(ae);
    roln_real e[32];
    int l, i, j, at = 0;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        roln_real sum = 0;
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j += 32) {
                const int count = n - j < 32 ? n - j : 32;
                rolni_ae_off(bits, read, theta, at, N, n, i, j, count, e);
                sum += roln_dot(count, e, e);
            }
        if (!roln_finite(sum)) return ROLN_E_NOT_FINITE;
        if (sum > ROLN_AE_OFF * ROLN_AE_OFF) return ROLN_E_ILL_CONDITIONED;
        at += ROLN_AE_LAYER(bits, N, n);
    }
    return ROLN_OK;
}

ROLN_FN roln_bits rolni_ae_bits_at(const void *theta, int i)
{
    roln_bits b;
    memcpy(&b, ROLNI_AS(const roln_real *, theta) + i, sizeof b);
    return b;
}

/* Is every layer a left inverse, |Psi^T Phi - I|_F <= ROLN_AE_OFF (of stored weights |(I + D) Psi^T Phi - I|_F)? Then no layer of
   the encoder gives the input u of the decoder's layer back farther off than ROLN_AE_OFF |u|. The bound is that of roln_ae_store,
   a hundredth, and a little for sums in another order; training keeps the norm near rounding (of every trained model of this
   repository it is below 2e-6, in float). theta [roln_ae_params] in.
   ROLN_E_ILL_CONDITIONED: a layer is not; ROLN_E_NOT_FINITE: a product is not finite.
   Cost of a layer: n^2 N multiply-adds, of stored weights, which are unpacked one by one, (n / 32 + 1) n^2 N. */
ROLN_FN roln_status roln_ae_check(const roln_ae *ae, const roln_real *theta)
{
    return rolni_ae_check(ae, rolni_ae_bits_at, theta);
}

#endif
