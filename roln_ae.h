/* SPDX-License-Identifier: MIT */
/* roln_ae.h - constrained autoencoder: decoder phi and encoder rho with rho(phi(z)) = z by construction.

   Otto, Macchio, Rowley 2023, as used by Friedl et al., ICLR 2025. Layers l = 0 .. L-1 of sizes
   N = N_0 >= N_1 >= ... >= N_L = n; weights Phi_l, Psi_l in R^{N_l x N_{l+1}} with Psi_l^T Phi_l = I, bias b_l in R^{N_l}:

       encoder layer   a = Psi^T (x - b),  y = s-(a)          decoder layer   x = Phi u + b,  u = s+(y)

   with s+ the inverse function of s-. Beyond the paper, a layer may keep its size (N_{l+1} = N_l): it then bends its input without
   reducing it. And the innermost layer may be bent by polynomials p(z) in place of an activation,

       encoder layer   z = Psi^T (x - b)              decoder layer   x = b + Phi z + (I - Phi Psi^T) W^T p(z)

   whose encoder is linear and whose W is found in closed form: a chart of the manifold that the data lie on (section 10). Such a
   layer may keep the last numbers of x as the last of z: the columns of Psi and the rows of Phi that belong to them have one
   number other than 0, and W has none for them.
   Everything works on 1-, 2- or 3-jets: position, velocity and acceleration go through the layers together, and no Jacobian or
   Hessian is formed.

   1 shape and layout     sizes, the weights in theta, the tape of a block
   2 activation           s- and s+, value and backward
   3 bend                 the polynomials p(z), the bent layer of the decoder and its backward
   4 encode               z = rho(x) and backward
   5 decode               x = phi(z) and backward, and single coordinates of x
   6 forces               tau_z = J^T tau and backward, tau = D^T tau_z
   7 initialisation       random, or principal directions of data
   8 stored weights       int8 or half-precision numbers in place of floats
   9 is it a left inverse?
   10 fit a chart         the bent layer in closed form, from a stream of samples

   A block of nb samples with `jets` planes is an array [jets][nb][dim]; jets = 1: positions, 2: with velocities,
   3: with accelerations. Forward functions write a tape that the backward of the same block reads. */

#ifndef ROLN_AE_H
#define ROLN_AE_H

#include "roln_spd.h"

/* ---- 1 shape and layout ----------------------------------------------------------------------- */

#define ROLN_AE_MAX 8 /* layers at most */

/* How the matrices of an autoencoder lie in theta, and the products that read them there. ROLN_FULL: as they are. roln_half and
   roln_int8 (section 8): as 16- or 8-bit numbers. Each function of a storage computes what the one of its comment does, but takes
   B in that form; A and C are numbers. */
typedef struct {
    int bits;                                                                                 /* of a weight */
    void (*mm)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);    /* roln_mm */
    void (*mm_bt)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C); /* roln_mm_bt */
    roln_real (*column)(int k, int n, int j, const roln_real *a, const roln_real *B);         /* sum_p a[p] B[p][j] */
} roln_storage;
#define ROLN_FULL NULL

/* What bends the innermost layer of an autoencoder: ROLN_UNBENT, it has an activation as all others; &roln_polynomial (section 3).
   Only the shape of a bent autoencoder names these functions, so that a program without one does not hold them. Their arguments are
   explained there. */
typedef struct roln_ae roln_ae;
typedef struct {
    void (*decode)(const roln_ae *ae, int jets, int nb, const roln_real *layer, roln_real *tape, roln_real *x);
    void (*bwd)(const roln_ae *ae, int jets, int nb, const roln_real *layer, const roln_real *tape, const roln_real *gx,
                roln_real *glayer, roln_real *gz, roln_real *work);
} roln_bend;
#define ROLN_UNBENT NULL

/* The shape of an autoencoder: all that gives its weights their meaning. */
struct roln_ae {
    int layers;                  /* L, 0 .. ROLN_AE_MAX; 0: no autoencoder, z = x */
    int size[ROLN_AE_MAX + 1];   /* N_0 >= N_1 >= ... >= N_L */
    roln_real slope;             /* k in (0,1], slope of the activation at +-infinity; 1 makes it the identity (POD) */
    const roln_storage *storage; /* ROLN_FULL; &roln_half or &roln_int8: for use only, there is no gradient with respect to theta */
    const roln_bend *bend;       /* ROLN_UNBENT; &roln_polynomial, if L > 0 and N_L < N_{L-1} */
    int degree, monomials;       /* of the polynomials, 2 .. ROLN_DEGREE_MAX, F = ROLN_MONOMIALS(N_L, degree); ROLN_UNBENT: 0 */
    int keeps;                   /* the last so many numbers of x are the last of z, each with a unit and an origin of its own: what
                                    drives the others. Below N_L; if above 0, L = 1, bent and ROLN_FULL */
};

/* Size macros of this header take S, a macro that gives sizes of the shape by name. In a function it is ROLNI_LOCAL, and the
   sizes are local ints of these names; the typed shell of roln.h gives enum constants instead.
       S(N), S(n)     N_0, N_L
       S(N1), S(N2)   N_1, N_2; 0 where there is no such layer, so that S(N1) > 0 means that there are layers
       S(ae_sum)      N_1 + N_2 + .. + N_L
       S(monomials)   F, the numbers of p(z), and S(bent), N_{L-1}, if layer L-1 is bent; else both 0
       S(ae_size)     roln_ae_params(ae) */

/* N_l, or 0 beyond the last layer. */
ROLN_FN int roln_ae_width(const roln_ae *ae, int l)
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

/* Nonzero if layer l is bent. */
ROLNI_INLINE int rolni_bends(const roln_ae *ae, int l)
{
    return ae->bend != ROLN_UNBENT && l == ae->layers - 1;
}

/* N_{L-1}, the size of the input of the bent layer, or 0. */
ROLN_FN int roln_ae_bent(const roln_ae *ae)
{
    return ae->bend == ROLN_UNBENT ? 0 : ae->size[ae->layers - 1];
}

/* Numbers that a row of n weights takes, and a layer N -> n but for W. */
#define ROLN_AE_ROW(bits, n) ((bits) == 8 ? 1 + ((n) + 7) / 8 * 2 : (bits) == 16 ? ((n) + 7) / 8 * 4 : (n))
#define ROLN_AE_LAYER(bits, N, n) \
    (2 * (n) * ROLN_AE_ROW(bits, N) + ((bits) > 0 ? (n) * ROLN_AE_ROW(bits, n) : 0) + (N))

/* Bits of a weight, 0 for ROLN_FULL. */
ROLN_FN int rolni_ae_bits(const roln_ae *ae)
{
    return ae->storage == ROLN_FULL ? 0 : ae->storage->bits;
}

/* ROLN_AE_ROW and ROLN_AE_LAYER of a shape. */
ROLN_FN int rolni_ae_row(const roln_ae *ae, int n)
{
    const int bits = rolni_ae_bits(ae);
    return ROLN_AE_ROW(bits, n);
}

ROLN_FN int rolni_ae_layer_size(const roln_ae *ae, int l)
{
    return ROLN_AE_LAYER(rolni_ae_bits(ae), ae->size[l], ae->size[l + 1]);
}

/* theta holds for l = 0 .. L-1: Phi_l^T [N_{l+1}][N_l], Psi_l^T [N_{l+1}][N_l], of stored weights D_l [N_{l+1}][N_{l+1}],
   and b_l [N_l]; behind them, if the last layer is bent, W [F][N_{L-1}]. Phi and Psi are transposed, so that their long side is
   contiguous. */
ROLN_FN int rolni_ae_layers(const roln_ae *ae) /* all but W */
{
    int l, sum = 0;
    for (l = 0; l < ae->layers; l++)
        sum += rolni_ae_layer_size(ae, l);
    return sum;
}

ROLN_FN int roln_ae_params(const roln_ae *ae)
{
    const int layers = rolni_ae_layers(ae);
    return ae->monomials > 0 ? layers + ae->monomials * rolni_ae_row(ae, roln_ae_bent(ae)) : layers;
}

/* The weights of layer l, which begin at theta; those of layer l + 1, or W, begin at end. */
typedef struct {
    const roln_real *phi, *psi, *d, *b, *end;
} rolni_ae_layer;

ROLN_FN rolni_ae_layer rolni_ae_layer_at(const roln_ae *ae, int l, const roln_real *theta)
{
    const int N = ae->size[l], matrix = ae->size[l + 1] * rolni_ae_row(ae, N);
    rolni_ae_layer w;
    w.phi = theta;
    w.psi = theta + matrix;
    w.d = w.psi + matrix;
    w.end = theta + rolni_ae_layer_size(ae, l);
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

/* The tape of a block. Encoder and decoder write the same layout, for l = 0 .. L-1 both sides of the activation of the layer:
       inner side [jets][nb][N_{l+1}]   encoder: a = Psi^T (x - b)                     decoder: u = s+(y)
       outer side [jets][nb][N_{l+1}]   encoder: y - b_{l+1}, input of layer l + 1     decoder: y
   At the same point, x = phi(z), a and u are the same numbers up to rounding, since Psi^T Phi = I. The encoder leaves out the
   outer side of the last layer, which is z, and has x - b_0 [jets][nb][N] in its place.
   Of a bent layer the inner side is a = z in the encoder, and s = z - Psi^T W^T p in the decoder, which has p [jets][nb][F] behind
   it. */
#define ROLN_AE_DECODE_TAPE(S, jets, nb) ((jets) * (nb) * (2 * S(ae_sum) + S(monomials)))
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

/* ---- 3 bend ----------------------------------------------------------------------------------- */

/* The innermost layer N_{L-1} -> n, bent by polynomials p(z):
       encoder   z = Psi^T (x - b)
       decoder   y = W^T p(z),  s = z - Psi^T y,  x = b + y + Phi s,  that is x = b + Phi z + (I - Phi Psi^T) W^T p(z)
   Since Psi^T Phi = I, Psi^T (x - b) = Psi^T y + s = z for every W. (Of stored weights Psi^T stands for (I + D) Psi^T.) W^T and
   W^T + Phi A are the same map: what W has along Phi has no effect.
   p(z): the polynomials of roln_spd.h, 9, of degree 2 .. d; degrees 0 and 1 are b and Phi. Phi, Psi and b hold the scale that
   brings the data to [-1, 1] (roln_chart_center). */

/* x - b of the bent layer whose weights begin at `layer`, and s. Its tape, of `rows` rows, has p and z; of stored weights, which no
   gradient asks for s, it gets Psi^T y in place of s. */
ROLN_FN void rolni_bent_rows(const roln_ae *ae, int rows, const roln_real *layer, roln_real *tape, roln_real *x)
{
    enum { ROLNI_PART = 8 }; /* numbers of s at a time */
    const int N = ae->size[ae->layers - 1], n = ae->size[ae->layers], F = ae->monomials, bits = rolni_ae_bits(ae);
    const rolni_ae_layer w = rolni_ae_layer_at(ae, ae->layers - 1, layer);
    roln_real *s = tape, *p = tape + rows * n, *z = p + rows * F, part[ROLNI_PART];
    int i, k, at;
    rolni_ae_mm(ae, rows, F, N, p, w.end, x); /* y */
    rolni_ae_mm_bt(ae, rows, N, n, x, w.psi, s);
    if (ae->storage == ROLN_FULL) {
        for (i = 0; i < rows * n; i++)
            s[i] = z[i] - s[i];
        rolni_mm(rows, n, N, s, ROLNI_AS(size_t, n), 1, w.phi, 1, x);
        return;
    }
    for (; rows > 0; rows--, s += n, z += n, x += N)
        for (at = 0; at < n; at += ROLNI_PART) {
            const int m = n - at < ROLNI_PART ? n - at : ROLNI_PART;
            rolni_ae_mm_bt(ae, 1, n, m, s, w.d + at * ROLN_AE_ROW(bits, n), part);
            for (k = 0; k < m; k++)
                part[k] = z[at + k] - (s[at + k] + part[k]); /* z - (I + D) Psi^T y */
            for (i = 0; i < N; i++)
                x[i] += ae->storage->column(m, N, i, part, w.phi + at * ROLN_AE_ROW(bits, N));
        }
}

/* p, and unless x is NULL x - b and s, from z, which stands on the tape. */
ROLN_FN void rolni_bent_decode(const roln_ae *ae, int jets, int nb, const roln_real *layer, roln_real *tape, roln_real *x)
{
    const int n = ae->size[ae->layers], F = ae->monomials, rows = jets * nb;
    roln_real *p = tape + rows * n, *z = p + rows * F;
    int r;
    for (r = 0; r < nb; r++)
        rolni_polynomials(n, ae->degree, jets, z + r * n, nb * n, p + r * F, nb * F);
    if (x) rolni_bent_rows(ae, rows, layer, tape, x);
}

/* Backward of the bent layer: from gx [jets][nb][N_{L-1}] the cotangent gz [jets][nb][n] of z, which is not added to; glayer, the
   gradient of the weights from Phi on, is, unless it is NULL. With gs = Phi^T gx:
       gy = gx - Psi gs,   gPsi -= y gs^T,   gPhi += gx s^T,   gW += p gy^T,   gz = gs + (dp/dz)^T W gy
   work [ROLNI_BENT_BACK_WORK]: y is first y, then gy. */
#define ROLNI_BENT_BACK_MEM(X, rows, N, monomials) X(y, (rows) * (N)) X(gp, (rows) * (monomials))
#define ROLNI_BENT_BACK_WORK(rows, N, monomials) (0 ROLNI_BENT_BACK_MEM(ROLNI_SIZE, rows, N, monomials))
ROLN_FN void rolni_bent_bwd(const roln_ae *ae, int jets, int nb, const roln_real *layer, const roln_real *tape,
                             const roln_real *gx, roln_real *glayer, roln_real *gz, roln_real *work)
{
    const int N = ae->size[ae->layers - 1], n = ae->size[ae->layers], F = ae->monomials, rows = jets * nb;
    const rolni_ae_layer w = rolni_ae_layer_at(ae, ae->layers - 1, layer);
    const roln_real *s = tape, *p = s + rows * n, *z = p + rows * F;
    int i, r;
    ROLNI_BENT_BACK_MEM(ROLNI_CARVE, rows, N, F)
    rolni_ae_mm_bt(ae, rows, N, n, gx, w.phi, gz); /* gs */
    if (glayer) {
        roln_real *gpsi = glayer + n * N, *gb = gpsi + n * N;
        roln_mm(rows, F, N, p, w.end, y);
        for (i = 0; i < rows * N; i++)
            y[i] = -y[i];
        roln_mm_at(n, rows, N, gz, y, gpsi);
        roln_mm_at(n, rows, N, s, gx, glayer);
        for (r = 0; r < nb; r++)
            for (i = 0; i < N; i++)
                gb[i] += gx[r * N + i];
    }
    if (ae->storage == ROLN_FULL) {
        roln_mm(rows, n, N, gz, w.psi, y);
    } else { /* Psi (I + D^T) gs */
        rolni_ae_mm(ae, rows, n, n, gz, w.d, gp);
        for (i = 0; i < rows * n; i++)
            gp[i] += gz[i];
        rolni_ae_mm(ae, rows, n, N, gp, w.psi, y);
    }
    for (i = 0; i < rows * N; i++)
        y[i] = gx[i] - y[i];
    if (glayer) roln_mm_at(F, rows, N, p, y, glayer + 2 * n * N + N);
    rolni_ae_mm_bt(ae, rows, N, F, y, w.end, gp);
    for (r = 0; r < nb; r++)
        rolni_polynomials_bwd(n, ae->degree, jets, z + r * n, nb * n, p + r * F, nb * F, gp + r * F, gz + r * n);
}

/* Derivatives of the bent layer at z [n]: T [n][N_{L-1}], row j that of x by z_j, and, added to H [n][n], those of the gradient of
   gx^T x, which are those of c^T p(z), c = W gy. work [ROLNI_BENT_JAC_WORK]. */
#define ROLNI_BENT_JAC_MEM(X, n, N, monomials) \
    X(zt, 2 * (n)) X(cz, 2 * (n)) X(gs, 2 * (n)) X(c, monomials) X(p, 2 * (monomials)) X(cp, 2 * (monomials)) \
    X(dp, (n) * (monomials)) X(s, 2 * (n) * (n)) X(x, (n) * (N))
#define ROLNI_BENT_JAC_WORK(n, N, monomials) ((monomials) > 0 ? 0 ROLNI_BENT_JAC_MEM(ROLNI_SIZE, n, N, monomials) : 0)
ROLN_FN void rolni_bent_jac(const roln_ae *ae, const roln_real *layer, const roln_real *z, const roln_real *gx, roln_real *T,
                            roln_real *H, roln_real *work)
{
    const int N = ae->size[ae->layers - 1], n = ae->size[ae->layers], F = ae->monomials, stored = ae->storage != ROLN_FULL;
    const rolni_ae_layer w = rolni_ae_layer_at(ae, ae->layers - 1, layer);
    int i, j;
    ROLNI_BENT_JAC_MEM(ROLNI_CARVE, n, N, F)
    rolni_ae_mm_bt(ae, 1, N, n, gx, w.phi, gs); /* gy = gx - Psi (I + D^T) Phi^T gx */
    if (stored) rolni_ae_mm(ae, 1, n, n, gs, w.d, gs + n);
    for (i = 0; i < n && stored; i++)
        gs[i] += gs[n + i];
    rolni_ae_mm(ae, 1, n, N, gs, w.psi, x);
    for (i = 0; i < N; i++)
        x[i] = gx[i] - x[i];
    rolni_ae_mm_bt(ae, 1, N, F, x, w.end, c);
    rolni_copy(n, z, zt);
    for (j = 0; j < n; j++) {
        for (i = 0; i < n; i++)
            zt[n + i] = i == j, cz[i] = cz[n + i] = 0;
        rolni_polynomials(n, ae->degree, 2, zt, n, p, F);
        rolni_copy(F, p + F, dp + j * F);
        rolni_zero(F, cp);
        rolni_copy(F, c, cp + F);
        rolni_polynomials_bwd(n, ae->degree, 2, zt, n, p, F, cp, cz);
        for (i = 0; i < n; i++)
            H[j * n + i] += cz[i];
    }
    rolni_ae_mm(ae, n, F, N, dp, w.end, T); /* y_j + Phi (e_j - (I + D) Psi^T y_j) */
    rolni_ae_mm_bt(ae, n, N, n, T, w.psi, s);
    if (stored) rolni_ae_mm_bt(ae, n, n, n, s, w.d, s + n * n);
    for (i = 0; i < n * n; i++)
        s[i] = (i % (n + 1) == 0) - (s[i] + (stored ? s[n * n + i] : 0));
    rolni_ae_mm(ae, n, n, N, s, w.phi, x);
    for (i = 0; i < n * N; i++)
        T[i] += x[i];
}

ROLNI_TABLE roln_bend roln_polynomial = {rolni_bent_decode, rolni_bent_bwd};

/* ---- 4 encode --------------------------------------------------------------------------------- */

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
        if (rolni_bends(ae, l)) rolni_copy(rows * n, a, y);
        else rolni_act(&s, 1, jets, nb * n, a, y);
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
    const int rows = jets * nb, L = ae->layers, N = ae->size[0], N1 = roln_ae_width(ae, 1);
    const roln_real *th = theta + rolni_ae_layers(ae), *a = tape + 2 * rows * roln_ae_sum(ae), *last = a - rows * ae->size[L];
    int l, i;
    ROLNI_AE_ENCODE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets, nb)
    if (L > 0) rolni_copy(rows * ae->size[L], gz, L % 2 ? odd : even);
    for (l = L - 1; l >= 0; l--) {
        const int Nl = ae->size[l], nl = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - rolni_ae_layer_size(ae, l));
        roln_real *g = l % 2 ? even : odd, *next = l % 2 ? odd : even;
        a -= 2 * rows * nl;
        if (!rolni_bends(ae, l)) rolni_act_bwd(&s, 1, jets, nb * nl, a, g);
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

/* ---- 5 decode --------------------------------------------------------------------------------- */

/* x = phi(z), xd = J zd, xdd = J zdd + (d/dt J) zd.
   theta, z [jets][nb][n] in; x [jets][nb][N], tape [ROLN_AE_DECODE_TAPE] out. x NULL: the tape alone, without the product with
   Phi_0, which is the largest; if layer 0 is bent, s is missing there, which only a gradient with respect to theta asks for. z may
   stand in its place, the last jets nb n numbers of the tape: then it is not copied; it stays.
   Cost as roln_ae_encode; of a bent layer jets nb (F + 2 n) N_{L-1} multiply-adds. */
ROLN_FN void roln_ae_decode(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *z, roln_real *x,
                            roln_real *tape)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb;
    const roln_real *th = theta + rolni_ae_layers(ae);
    roln_real *u = tape + 2 * rows * roln_ae_sum(ae), *y = u;
    int l, i, r;
    if (ae->layers > 0) y += rows * ae->monomials - rows * ae->size[ae->layers];
    if (ae->layers > 0 && z != y) rolni_copy(rows * ae->size[ae->layers], z, y);
    if (ae->layers == 0 && x) rolni_copy(rows * ae->size[0], z, x);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - rolni_ae_layer_size(ae, l));
        const roln_real *from = y;
        u -= 2 * rows * n;
        y = l > 0 ? u - rows * N : x;
        if (rolni_bends(ae, l)) {
            ae->bend->decode(ae, jets, nb, w.phi, u, y);
        } else {
            rolni_act(&s, -1, jets, nb * n, from, u);
            if (y) rolni_ae_mm(ae, rows, n, N, u, w.phi, y);
        }
        if (!y) return;
        for (r = 0; r < nb; r++)
            for (i = 0; i < N; i++)
                y[r * N + i] += w.b[i];
        th = w.phi;
    }
}

/* The cotangent of z [jets][nb][n] from that of x, gx, without adding it to anything: it stands in work [ROLN_AE_DECODE_BWD_WORK],
   or is gx itself if there are no layers. */
#define ROLNI_AE_DECODE_BWD_MEM(X, S, jets, nb) X(odd, (jets) * (nb) * S(N1)) X(even, (jets) * (nb) * S(N2))
#define ROLN_AE_DECODE_BWD_WORK(S, jets, nb) \
    (0 ROLNI_AE_DECODE_BWD_MEM(ROLNI_SIZE, S, jets, nb) + ROLNI_BENT_BACK_WORK((jets) * (nb), S(bent), S(monomials)))
ROLN_FN const roln_real *rolni_decode_bwd(const roln_ae *ae, int jets, int nb, const roln_real *theta, const roln_real *tape,
                                           const roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int rows = jets * nb, N1 = roln_ae_width(ae, 1), N2 = roln_ae_width(ae, 2);
    const roln_real *g = gx;
    int l, i, r;
    ROLNI_AE_DECODE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets, nb)
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, theta);
        const roln_real *u = tape, *y = u + rows * n;
        roln_real *gu = l % 2 ? even : odd;
        if (rolni_bends(ae, l)) {
            ae->bend->bwd(ae, jets, nb, theta, tape, g, gtheta, gu, work);
            return gu;
        }
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
    const roln_real *g = rolni_decode_bwd(ae, jets, nb, theta, tape, gx, gtheta, work);
    int i;
    for (i = 0; gz && i < jets * nb * ae->size[ae->layers]; i++)
        gz[i] += g[i];
}

/* ---- 6 forces --------------------------------------------------------------------------------- */

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
    const int N = ae->size[0], n = ae->size[ae->layers], N1 = roln_ae_width(ae, 1), ae_sum = roln_ae_sum(ae);
    const int monomials = ae->monomials;
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
    roln_ae_decode(ae, 2, nb, theta, zy, gtau || (gtheta && monomials > 0) ? jet : NULL, tape);
    for (i = 0; gtau && i < nb * N; i++)
        gtau[i] += jet[nb * N + i];
    rolni_zero(nb * N, jet);
    rolni_copy(nb * N, tau, jet + nb * N);
    g = rolni_decode_bwd(ae, 2, nb, theta, tape, jet, gtheta, work);
    for (i = 0; gz && i < nb * n; i++)
        gz[i] += g[i];
}

/* Derivatives of roln_ae_reduce at one z [n]: T = J^T [n][N], row j that of x by z_j, and H [n][n], row j that of tau_z by z_j,
   out; tau [N] in. Back through the layers for the cotangents gu of u = s+(y), then n directions forward, which meet them,
       H_jk = sum_i s+''(y_i) gu_i y_ji y_ki   over all layers.
   Cost: n + 2 products with each Phi. work [ROLN_AE_REDUCE_JAC_WORK]. */
#define ROLNI_AE_REDUCE_JAC_MEM(X, S) \
    X(tape, ROLN_AE_DECODE_TAPE(S, 1, 1)) X(first, S(ae_sum)) X(second, S(ae_sum)) X(g, S(N1)) X(a, 2 * S(N1)) X(w, 2 * S(N1)) \
    X(sums, S(n)) X(odd, S(n) * S(N1)) X(even, S(n) * S(N2))
#define ROLN_AE_REDUCE_JAC_WORK(S) \
    (S(N1) > 0 ? 0 ROLNI_AE_REDUCE_JAC_MEM(ROLNI_SIZE, S) + ROLNI_BENT_JAC_WORK(S(n), S(bent), S(monomials)) : 0)
ROLN_FN void roln_ae_reduce_jac(const roln_ae *ae, const roln_real *theta, const roln_real *z, const roln_real *tau, roln_real *T,
                                roln_real *H, roln_real *work)
{
    const rolni_knee s = rolni_knee_of(ae->slope);
    const int n = ae->size[ae->layers], N1 = roln_ae_width(ae, 1), N2 = roln_ae_width(ae, 2), ae_sum = roln_ae_sum(ae);
    const int monomials = ae->monomials, L = ae->layers;
    const roln_real *from = tau;
    roln_real *u, *to;
    int l, i, j, at = 0;
    ROLNI_AE_REDUCE_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_zero(n * n, H);
    to = L == 0 ? T : L % 2 ? odd : even;
    for (i = 0; i < n * n; i++)
        to[i] = i % (n + 1) == 0;
    if (L == 0) return;
    roln_ae_decode(ae, 1, 1, theta, z, NULL, tape);
    for (u = tape, l = 0; l < L && !rolni_bends(ae, l); l++) { /* first: s', second: s'' gu */
        const int m = ae->size[l + 1];
        const rolni_ae_layer layer = rolni_ae_layer_at(ae, l, theta);
        rolni_ae_mm_bt(ae, 1, ae->size[l], m, from, layer.phi, first + at);
        for (i = 0; i < m; i++)
            a[i] = u[m + i], a[m + i] = 1, w[i] = 0, w[m + i] = 1;
        rolni_act_bwd(&s, -1, 2, m, a, w);
        for (i = 0; i < m; i++) {
            second[at + i] = w[i] * first[at + i];
            g[i] = w[m + i] * first[at + i];
            first[at + i] = w[m + i];
        }
        from = g, theta = layer.end, u += 2 * m, at += m;
    }
    if (l < L) {
        to = l == 0 ? T : l % 2 ? odd : even;
        rolni_bent_jac(ae, theta, z, from, to, H, work); /* by name: programs that control only shall not hold it */
    }
    for (l--; l >= 0; l--) {
        const int N = ae->size[l], m = ae->size[l + 1];
        roln_real *const y = to;
        theta -= rolni_ae_layer_size(ae, l), at -= m;
        to = l == 0 ? T : l % 2 ? odd : even;
        for (j = 0; j < n; j++) {
            for (i = 0; i < m; i++)
                w[i] = second[at + i] * y[j * m + i];
            roln_mm_bt(1, m, n, w, y, sums);
            for (i = 0; i < n; i++)
                H[j * n + i] += sums[i];
        }
        for (i = 0; i < n * m; i++)
            y[i] *= first[at + i % m];
        rolni_ae_mm(ae, n, m, N, y, rolni_ae_layer_at(ae, l, theta).phi, to);
    }
}

/* What roln_ae_lift needs of the tape of roln_ae_decode or roln_ae_encode at a point: the positions on the inner side of every
   layer, with which a lift at x = phi(z) need not encode x; of a bent one, whose encoder is linear, they are not read. tape: of
   jets planes; lift_tape [ROLN_AE_LIFT_TAPE] out, which may be the beginning of tape. */
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
    const int L = ae->layers, N1 = roln_ae_width(ae, 1), N2 = roln_ae_width(ae, 2);
    const roln_real *th = theta + rolni_ae_layers(ae), *a = lift_tape + nb * roln_ae_sum(ae);
    int l, i;
    ROLNI_AE_LIFT_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    roln_real *first = L == 0 ? tau : L % 2 ? odd : even;
    for (i = 0; i < nb * ae->size[L]; i++)
        first[i] = 0 + tau_z[i]; /* 0 + makes -0 a 0 */
    for (l = L - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const rolni_ae_layer w = rolni_ae_layer_at(ae, l, th - rolni_ae_layer_size(ae, l));
        roln_real *g = l % 2 ? even : odd, *next = l == 0 ? tau : l % 2 ? odd : even;
        a -= nb * n;
        if (!rolni_bends(ae, l)) rolni_act_bwd(&s, 1, 1, nb * n, a, g);
        if (ae->storage != ROLN_FULL) { /* ga += D^T ga */
            rolni_ae_mm(ae, nb, n, n, g, w.d, next);
            for (i = 0; i < nb * n; i++)
                g[i] += next[i];
        }
        rolni_ae_mm(ae, nb, n, N, g, w.psi, next); /* gx = Psi ga */
        th = w.phi;
    }
}

/* ---- 7 initialisation ------------------------------------------------------------------------- */

/* Random weights: T [n][N] xavier-normal of gain 0.99, Psi^T = T, Phi^T = (T T^T)^-1 T, b = 0, so Psi^T Phi = I; T = I
   where a layer keeps its size; numbers that are kept stand by themselves; W = 0. theta out, seed in and out, work
   [ROLN_AE_INIT_WORK].
   ROLN_E_NOT_SPD: rows of some T are dependent to working precision, which has next to no probability; theta is then unusable, but
   seed has moved on, so that another call draws other numbers. ROLN_E_SHAPE: not ROLN_FULL; nothing is written. */
#define ROLNI_AE_INIT_MEM(X, S) X(G, S(N1) * S(N1)) X(col, S(N1)) /* Gram matrix, one column */
#define ROLN_AE_INIT_WORK(S) (0 ROLNI_AE_INIT_MEM(ROLNI_SIZE, S))
ROLN_FN roln_status roln_ae_init(const roln_ae *ae, roln_real *theta, uint64_t *seed, roln_real *work)
{
    const int N1 = roln_ae_width(ae, 1);
    int l, i, j;
    ROLNI_AE_INIT_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1];
        const roln_real sd = ROLN_C(0.99) * ROLN_SQRT(2 / ROLNI_AS(roln_real, N + n));
        roln_real *phi = theta, *psi = theta + n * N, *b = psi + n * N;
        for (i = 0; i < n * N; i++)
            psi[i] = n < N ? sd * roln_normal(seed) : ROLNI_AS(roln_real, i % (n + 1) == 0);
        for (i = 0; i < n && ae->keeps > 0; i++)
            for (j = i < n - ae->keeps ? N - ae->keeps : 0; j < N; j++)
                psi[i * N + j] = ROLNI_AS(roln_real, j - N == i - n);
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
    rolni_zero(ae->monomials * roln_ae_bent(ae), theta);
    return ROLN_OK;
}

/* As ROLNI_CARVE, of scratch in double, `room`. */
#define ROLNI_CARVE_DOUBLE(name, size) double *const name = (room += (size)) - (size);

#if ROLN_SIMD
typedef double rolni_vd __attribute__((__vector_size__(ROLNI_BYTES), __aligned__(sizeof(double)), __may_alias__));
#endif

/* c[j] += sum_r A[r lda] B[r ldb + j], j < n, r = 0 .. k-1 one after the other. */
ROLN_FN void rolni_add_rows(int k, int n, const double *A, int lda, const double *B, int ldb, double *c)
{
    int j = 0, r;
#if ROLN_SIMD
    enum { ROLNI_DOUBLES = ROLNI_BYTES / sizeof(double) };
    for (; j + 4 * ROLNI_DOUBLES <= n; j += 4 * ROLNI_DOUBLES) {
        rolni_vd *const d = ROLNI_AS(rolni_vd *, ROLNI_AS(void *, c + j));
        rolni_vd c0 = d[0], c1 = d[1], c2 = d[2], c3 = d[3];
        for (r = 0; r < k; r++) {
            const double a = A[r * lda];
            const rolni_vd *const b = ROLNI_AS(const rolni_vd *, ROLNI_AS(const void *, B + r * ldb + j));
            c0 += a * b[0], c1 += a * b[1], c2 += a * b[2], c3 += a * b[3];
        }
        d[0] = c0, d[1] = c1, d[2] = c2, d[3] = c3;
    }
    for (; j + ROLNI_DOUBLES <= n; j += ROLNI_DOUBLES) {
        rolni_vd *const d = ROLNI_AS(rolni_vd *, ROLNI_AS(void *, c + j));
        rolni_vd c0 = d[0];
        for (r = 0; r < k; r++)
            c0 += A[r * lda] * *ROLNI_AS(const rolni_vd *, ROLNI_AS(const void *, B + r * ldb + j));
        d[0] = c0;
    }
#endif
    for (; j < n; j++) {
        double sum = c[j];
        for (r = 0; r < k; r++)
            sum += A[r * lda] * B[r * ldb + j];
        c[j] = sum;
    }
}

/* New coordinates of a bent layer N -> n, whose weights begin at `layer`: z' = (z - mid) / half, so that z_min .. z_max becomes
   -1 .. 1. Psi' = Psi / half, Phi' = half Phi, b' = b + Phi mid, W' = 0. */
ROLN_FN void rolni_stretch(int N, int n, int F, const roln_real *z_min, const roln_real *z_max, roln_real *layer)
{
    roln_real *phi = layer, *psi = phi + n * N, *b = psi + n * N;
    int i, j;
    for (i = 0; i < n; i++) {
        const roln_real half = z_max[i] / 2 - z_min[i] / 2, mid = z_max[i] / 2 + z_min[i] / 2;
        for (j = 0; j < N; j++) {
            b[j] += mid * phi[i * N + j];
            phi[i * N + j] *= half;
            psi[i * N + j] /= half;
        }
    }
    rolni_zero(F * N, b + N);
}

/* The range of the first nz principal coordinates, eigenvectors V [nz][N], over the samples: range [2][nz], lows and highs, behind
   the activations of the layers but the last. ROLN_E_ILL_CONDITIONED: one of them is as narrow as the rounding of another. x1 [N]:
   scratch. */
ROLN_FN roln_status rolni_pod_range(const roln_ae *ae, int count, const roln_real *x, roln_real scale, const roln_real *each,
                                    const roln_real *V, const roln_real *mean, roln_real *x1, roln_real *range)
{
    const int N = ae->size[0], nz = ae->size[ae->layers];
    const rolni_knee s = rolni_knee_of(ae->slope);
    roln_real widest = 0;
    int k, i, j;
    rolni_zero(2 * nz, range);
    for (k = 0; k < count; k++) {
        for (j = 0; j < N; j++) {
            const roln_real unit = each ? scale / each[j] : scale;
            x1[j] = unit * x[ROLNI_AS(size_t, k) * ROLNI_AS(size_t, N) + ROLNI_AS(size_t, j)] - mean[j];
        }
        for (i = 0; i < nz; i++) {
            const roln_real a = roln_dot(N, V + i * N, x1);
            range[i] = k == 0 || a < range[i] ? a : range[i];
            range[nz + i] = k == 0 || a > range[nz + i] ? a : range[nz + i];
        }
    }
    for (i = 0; i < nz; i++)
        widest = range[nz + i] - range[i] > widest ? range[nz + i] - range[i] : widest;
    for (i = 0; i < nz; i++)
        if (!(range[nz + i] - range[i] > 64 * ROLN_EPS * widest)) return ROLN_E_ILL_CONDITIONED;
    for (k = 1; k < ae->layers; k++)
        for (i = 0; i < 2; i++) {
            rolni_act(&s, 1, 1, nz, range + i * nz, x1);
            rolni_copy(nz, x1, range + i * nz);
        }
    return ROLN_OK;
}

/* Directions that are known: V [count][N], which are orthonormal, and lift [count][N], V, but for numbers that are kept what x
   follows them with. */
typedef struct {
    int count;
    const roln_real *V, *lift;
} rolni_known;

ROLN_FN rolni_known rolni_known_of(int count, const roln_real *V, const roln_real *lift)
{
    rolni_known k;
    k.count = count, k.V = V, k.lift = lift;
    return k;
}

/* x [N] without what is known of it: less lift_i times its part along V_i, one after the other. */
ROLN_FN void rolni_leave(int N, const rolni_known *known, double *x)
{
    int i, j;
    for (i = 0; i < known->count; i++) {
        double along = 0;
        for (j = 0; j < N; j++)
            along += ROLNI_AS(double, known->V[i * N + j]) * x[j];
        for (j = 0; j < N; j++)
            x[j] -= along * ROLNI_AS(double, known->lift[i * N + j]);
    }
}

/* mean [N] of the count samples scale * x [count][N], by joint divided by each [N] or NULL, and Q = sum (x - mean)(x - mean)^T
   [N][N], of what is left of x - mean without what is known (rolni_leave), summed in double: as float each of 100,000 samples
   would be rounded to the sum of all, and small directions would be noise. ROLNI_POD_ROWS rows of Q at a time, each for a pass over
   the samples, so that room is small. room [ROLN_AE_POD_ROOM]. */
#define ROLNI_POD_ROWS 8
#define ROLNI_POD_SAMPLES 4
#define ROLNI_AE_POD_ROOM_MEM(X, N) \
    X(sum, ((N) < ROLNI_POD_ROWS ? (N) : ROLNI_POD_ROWS) * (N)) X(part, ROLNI_POD_SAMPLES * (N))
#define ROLN_AE_POD_ROOM(S) (S(N1) > 0 ? 0 ROLNI_AE_POD_ROOM_MEM(ROLNI_SIZE, S(N)) : 0)
ROLN_FN void rolni_pod_sums(int N, int count, const roln_real *x, roln_real scale, const roln_real *each,
                            const rolni_known *known, roln_real *mean, roln_real *Q, double *room)
{
    const double unit = ROLNI_AS(double, scale);
    int from, k, i, j;
    ROLNI_AE_POD_ROOM_MEM(ROLNI_CARVE_DOUBLE, N)
    for (j = 0; j < N; j++)
        sum[j] = 0;
    for (k = 0; k < count; k++)
        for (j = 0; j < N; j++)
            sum[j] += ROLNI_AS(double, x[ROLNI_AS(size_t, k) * ROLNI_AS(size_t, N) + ROLNI_AS(size_t, j)]);
    for (j = 0; j < N; j++)
        mean[j] = ROLNI_AS(roln_real, (each ? unit / ROLNI_AS(double, each[j]) : unit) * sum[j] / count);
    for (from = 0; from < N; from += ROLNI_POD_ROWS) {
        const int rows = N - from < ROLNI_POD_ROWS ? N - from : ROLNI_POD_ROWS, cols = known->count > 0 ? N : from + rows;
        for (i = 0; i < rows * N; i++)
            sum[i] = 0;
        for (k = 0; k < count; k += ROLNI_POD_SAMPLES) {
            const int now = count - k < ROLNI_POD_SAMPLES ? count - k : ROLNI_POD_SAMPLES;
            const roln_real *in = x + ROLNI_AS(size_t, k) * ROLNI_AS(size_t, N);
            for (i = 0; i < now; i++)
                for (j = 0; j < cols; j++)
                    part[i * N + j] = (each ? unit / ROLNI_AS(double, each[j]) : unit) * ROLNI_AS(double, in[i * N + j]) -
                                      ROLNI_AS(double, mean[j]);
            for (i = 0; i < now; i++)
                rolni_leave(N, known, part + i * N);
            for (i = 0; i < rows; i++)
                rolni_add_rows(now, from + i + 1, part + from + i, N, part, N, sum + i * N);
        }
        for (i = 0; i < rows; i++)
            for (j = 0; j <= from + i; j++)
                Q[(from + i) * N + j] = Q[j * N + from + i] = ROLNI_AS(roln_real, sum[i * N + j]);
    }
}

/* Q [N][N] with the directions V [known][N], along which nothing is left, at an eigenvalue below all others. */
ROLN_FN void rolni_pod_bar(int N, int known, const roln_real *V, roln_real *Q)
{
    roln_real all = 0;
    int i, j, k;
    for (i = 0; i < N; i++)
        all += Q[i * (N + 1)];
    if (!(all > 0)) all = 1;
    for (k = 0; k < known; k++)
        for (i = 0; i < N; i++)
            for (j = 0; j < N; j++)
                Q[i * N + j] -= all * V[k * N + i] * V[k * N + j];
}

/* v [N] = the direction q [N] without what rounding has left in it of V [known][N], of length 1 again. */
ROLN_FN void rolni_pod_direction(int N, int known, const roln_real *V, const roln_real *q, roln_real *v)
{
    int i, j;
    rolni_copy(N, q, v);
    if (known == 0) return;
    for (i = 0; i < known; i++) {
        const roln_real along = roln_dot(N, V + i * N, v);
        for (j = 0; j < N; j++)
            v[j] -= along * V[i * N + j];
    }
    {
        const roln_real length = ROLN_SQRT(roln_dot(N, v, v));
        for (j = 0; j < N; j++)
            v[j] /= length;
    }
}

/* Of numbers that are kept, from the sums Q [N][N] of all: V_i = their columns of I, lift_i = what x follows them with, the least
   squares of x by them, both [kept][N]. ROLN_E_ILL_CONDITIONED: one of them does not move, or is a combination of the others. */
#define ROLNI_POD_KEPT_MEM(X, kept) X(A, (kept) * (kept)) X(y, kept)
#define ROLNI_POD_KEPT_WORK(kept) (0 ROLNI_POD_KEPT_MEM(ROLNI_SIZE, kept))
ROLN_FN roln_status rolni_pod_kept(int N, int kept, const roln_real *Q, roln_real *V, roln_real *lift, roln_real *work)
{
    const int from = N - kept;
    int i, j;
    ROLNI_POD_KEPT_MEM(ROLNI_CARVE, kept)
    for (i = 0; i < kept; i++)
        rolni_copy(kept, Q + (from + i) * N + from, A + i * kept);
    if (roln_chol(kept, A, A) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
    for (j = 0; j < N; j++) {
        rolni_copy(kept, Q + j * N + from, y);
        roln_solve_lower(kept, A, y, y);
        roln_solve_lower_t(kept, A, y, y);
        for (i = 0; i < kept; i++) {
            V[i * N + j] = ROLNI_AS(roln_real, j == from + i);
            lift[i * N + j] = j < from ? y[i] : V[i * N + j];
        }
    }
    return ROLN_OK;
}

/* V and lift [N1][N] of rolni_leave, those of the kept numbers first, become Psi and Phi, those last. room [N1][N]. */
ROLN_FN void rolni_pod_last(int N, int N1, int kept, roln_real *V, roln_real *lift, roln_real *room)
{
    int i, k;
    for (k = 0; k < 2; k++) {
        roln_real *const rows = k == 0 ? V : lift;
        rolni_copy(N1 * N, rows, room);
        for (i = 0; i < N1; i++)
            rolni_copy(N, room + (i + kept) % N1 * N, rows + i * N);
    }
    for (i = 0; i < N1 - kept; i++)
        for (k = 0; k < kept; k++)
            V[i * N + N - kept + k] = -roln_dot(N, V + i * N, lift + (N1 - kept + k) * N);
}

/* Start at the linear optimum of the count samples scale * x [count][N], by joint divided by each [N] or NULL: b_0 = mean,
   Phi_0 = Psi_0 = the first N_1 principal directions (POD), later layers Phi = Psi = [I; 0], b = 0. Since s+(s-(x)) = x the
   autoencoder then is the rank-n POD. Of numbers that are kept: the POD of what is left of x without the part that follows them. A
   bent layer gets coordinates in which the samples lie in [-1, 1], and W = 0. theta out, untouched unless ROLN_OK; room
   [ROLN_AE_POD_ROOM], work [ROLN_AE_POD_WORK]. Status of roln_eig; ROLN_E_ILL_CONDITIONED, of a bent layer: the samples do not fill
   n dimensions, or a kept number does not move by itself; ROLN_E_SHAPE: not ROLN_FULL. Cost N^2 count / 2 in double, 9 N^3.
   Directions whose variance is below the part ROLN_EPS^1/2 of the largest are found again, in what is left of the samples without
   the others, at the same cost: rounding of the largest would be a part of them (test_ae.c: test_pod_of_many). */
#define ROLNI_AE_POD_MEM(X, S) \
    X(Q, S(N) * S(N)) /* covariance, then eigenvectors */ X(eval, S(N)) /* eigenvalues, then one sample */ X(mean, S(N)) \
    X(V, S(N1) * S(N)) /* directions, the largest first */ X(follow, (S(keeps) > 0) * S(N1) * S(N))
#define ROLN_AE_POD_WORK(S) \
    (S(N1) > 0 ? 0 ROLNI_AE_POD_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLN_EIG_WORK(S(N)), ROLNI_POD_KEPT_WORK(S(keeps))) : 0)
ROLN_FN roln_status roln_ae_init_pod(const roln_ae *ae, int count, const roln_real *x, roln_real scale, const roln_real *each,
                                     roln_real *theta, double *room, roln_real *work)
{
    const int N = ae->size[0], N1 = ae->size[1], nz = ae->size[ae->layers], keeps = ae->keeps;
    roln_status st;
    int known, before, l, i;
    roln_real *lift;
    rolni_known done;
    ROLNI_AE_POD_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (ae->layers == 0) return ROLN_OK;
    lift = keeps > 0 ? follow : V;
    done = rolni_known_of(0, V, lift);
    if (keeps > 0) rolni_pod_sums(N, count, x, scale, each, &done, mean, Q, room);
    if (keeps > 0 && (st = rolni_pod_kept(N, keeps, Q, V, lift, work)) != ROLN_OK) return st;
    for (known = keeps; known < N1;) {
        roln_real least;
        done.count = known;
        rolni_pod_sums(N, count, x, scale, each, &done, mean, Q, room);
        rolni_pod_bar(N, known, V, Q);
        if ((st = roln_eig(N, Q, eval, Q, work)) != ROLN_OK) return st;
        least = ROLN_SQRT(ROLN_EPS) * eval[N - 1];
        before = known;
        for (i = N - 1; known < N1 && (i == N - 1 || !(eval[i] < least)); i--, known++) {
            rolni_pod_direction(N, before > 0 ? known : 0, V, Q + i * N, V + known * N);
            if (keeps > 0) rolni_copy(N, V + known * N, lift + known * N);
        }
    }
    if (keeps > 0) rolni_pod_last(N, N1, keeps, V, lift, Q);
    if (ae->monomials > 0 && (st = rolni_pod_range(ae, count, x, scale, each, V, mean, eval, work)) != ROLN_OK) return st;
    rolni_copy(N1 * N, lift, theta);
    rolni_copy(N1 * N, V, theta + N1 * N);
    rolni_copy(N, mean, theta + 2 * N1 * N);
    for (l = 1; l < ae->layers; l++) {
        const int Nl = ae->size[l], nl = ae->size[l + 1];
        theta += ROLN_AE_LAYER(0, ae->size[l - 1], Nl);
        rolni_zero(2 * nl * Nl + Nl, theta);
        for (i = 0; i < nl; i++)
            theta[i * Nl + i] = theta[(nl + i) * Nl + i] = 1;
    }
    if (ae->monomials > 0) rolni_stretch(roln_ae_bent(ae), nz, ae->monomials, work, work + nz, theta);
    return ROLN_OK;
}

/* ---- 8 stored weights ------------------------------------------------------------------------- */

/* Weights that take less flash; arithmetic stays float. A storage is how a matrix lies in theta, roln_storage; to store weights is
   to round them to one, roln_ae_quantise. A row of n weights is
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
    if (bits > 0 && i >= 0) { /* W */
        const int row = ROLN_AE_ROW(bits, roln_ae_bent(ae));
        if (i < ae->monomials * row) return bits == 8 && i % row == 0;
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

/* column: sum_p (a[p] s_p) q_pj in order 1. */
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
ROLNI_STORAGE(roln_half, 16)
ROLNI_STORAGE(roln_int8, 8)
#undef ROLNI_STORAGE

/* The half nearest to x, the even one of two; 0x7c00 or more if |x| is beyond the largest half, 65504. Below 2^-14 halves are 2^-24
   apart, as floats from 0.5 on are. */
ROLN_FN uint32_t rolni_to_half(float x)
{
    const uint32_t b = rolni_bits(x), size = b & ~ROLNI_SIGN, moved = size - UINT32_C(0x38000000); /* 2^-112 |x| */
    return (b >> 16 & 0x8000) | (size < UINT32_C(0x38800000) ? rolni_bits(0.5f + rolni_real(size)) - UINT32_C(0x3f000000)
                                                             : (moved + 0xfff + (moved >> 13 & 1)) >> 13);
}

/* Rows [rows][n] of x, rounded to a storage of so many bits, into out. A row of int8 whose s would be denormal becomes 0.
   ROLN_E_NOT_FINITE; ROLN_E_RANGE: an entry is larger than the largest half. out is then unusable. */
ROLN_FN roln_status rolni_quantise_matrix(int bits, int rows, int n, const float *x, float *out)
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

/* The decoder of a layer, x = B^T v with B = [b; Phi^T] [m][N], m = n + 1, and v = [1; s+(y)] from the layers behind it, is stored
   in three steps once those are. Of a bent layer B = [b; Phi^T; W], m = 1 + n + F, and v = [1; z; p(z)]: that is the layer, once W
   has lost what it has along Phi. Plain rounding of Phi to int8 costs eight times as much on pend16, and Psi, which D corrects,
   next to nothing.

   1 What the layer gets: H = sum v v^T, G = sum v (v_full - v)^T [m][m] over states drawn from the box of z_min, z_max; v comes
   from the stored layers behind it, v_full from the full ones. part: the autoencoder from this layer on, whose weights begin at
   `stored` and `full`; of this layer itself none is read. tape_size: of the decoder of part, for one state. */
#define ROLNI_QUANTISE_MOMENTS_MEM(X, m, tape_size) X(v, m) X(off, m) X(tape, tape_size) /* off = v_full - v */
#define ROLNI_QUANTISE_MOMENTS_WORK(m, tape_size) (0 ROLNI_QUANTISE_MOMENTS_MEM(ROLNI_SIZE, m, tape_size))
ROLN_FN void rolni_quantise_moments(const roln_ae *part, const float *full, const float *stored, const float *z_min,
                                 const float *z_max, float *H, float *G, float *work)
{
    enum { ROLNI_DRAWS = 1024 };
    const int n = part->size[1], nz = part->size[part->layers], bends = rolni_bends(part, 0), F = part->monomials;
    const int m = n + 1 + (bends ? F : 0);
    roln_ae plain = *part;
    uint64_t seed = 1;
    int k, i;
    ROLNI_QUANTISE_MOMENTS_MEM(ROLNI_CARVE, m, 2 * roln_ae_sum(part) + F)
    float *z = work - nz; /* in its place on the tape */
    plain.storage = ROLN_FULL;
    rolni_zero(m * m, H);
    rolni_zero(m * m, G);
    v[0] = 1, off[0] = 0;
    for (k = 0; k < ROLNI_DRAWS; k++) {
        for (i = 0; i < nz; i++)
            z[i] = z_min[i] + (z_max[i] - z_min[i]) * roln_uniform(&seed);
        roln_ae_decode(part, 1, 1, stored, z, NULL, tape);
        rolni_copy(n, bends ? z : tape, v + 1);
        if (bends) rolni_copy(F, tape + n, v + 1 + n);
        else roln_ae_decode(&plain, 1, 1, full, z, NULL, tape);
        for (i = 1; i < m; i++)
            off[i] = bends ? 0 : tape[i - 1] - v[i];
        roln_mm_at(m, 1, m, v, v, H);
        roln_mm_at(m, 1, m, v, off, G);
    }
}

/* 2 What it should do: sum |B^T v - B_full^T v_full|^2 + e |B - B_full|^2 is least at B = B_full + (H + e I)^-1 G B_full; e is a
   little of the mean of H_ii. B [m][N]: B_full in, B out; H in, L out, L L^T = H + e I; G is spent. */
#define ROLNI_QUANTISE_FIT_MEM(X, m, N) X(change, (m) * (N)) X(col, m)
#define ROLNI_QUANTISE_FIT_WORK(m, N) (0 ROLNI_QUANTISE_FIT_MEM(ROLNI_SIZE, m, N))
ROLN_FN roln_status rolni_quantise_fit(int m, int N, float *H, float *G, float *B, float *work)
{
    const float little = 1e-3f;
    float trace = 0;
    int i, j;
    ROLNI_QUANTISE_FIT_MEM(ROLNI_CARVE, m, N)
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
    roln_mm(m, m, N, G, B, change);
    for (i = 0; i < m * N; i++)
        B[i] += change[i];
    return ROLN_OK;
}

/* 3 Rounding B to Q adds |L^T E|^2 = sum_p L_pp^2 |e_p + sum_{r>p} (L_rp / L_pp) e_r|^2, E = B - Q with rows e_p. From the last row
   to the first, b_p + sum_{r>p} .. is rounded to q_p, which makes good the errors behind it; row 0, b, need not be rounded
   (Babai 1986; Frantar et al. 2022 for networks). phi, b: where they are to lie, W behind b. E [m][N] scratch. */
ROLN_FN roln_status rolni_quantise_rows(const roln_storage *storage, int m, int N, int n, const float *L, const float *B,
                                        float *phi, float *b, float *E)
{
    const int row = ROLN_AE_ROW(storage->bits, N);
    int p, r, j;
    for (p = m - 1; p >= 0; p--) {
        const float *w = B + p * N;
        float *e = E + p * N, *q;
        roln_status st;
        rolni_copy(N, w, e);
        for (r = p + 1; r < m; r++)
            for (j = 0; j < N; j++)
                e[j] += L[r * m + p] / L[p * (m + 1)] * E[r * N + j];
        if (p == 0) continue;
        q = p <= n ? phi + (p - 1) * row : b + N + (p - 1 - n) * row;
        if ((st = rolni_quantise_matrix(storage->bits, 1, N, e, q)) != ROLN_OK) return st;
        rolni_read_matrix(storage, 1, N, q, e);
        for (j = 0; j < N; j++)
            e[j] = w[j] - e[j];
    }
    rolni_copy(N, E, b);
    return roln_all_finite(N, b) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Phi, b and W of layer l by the three steps; full, out: where the layer begins; the layers behind it are stored. */
#define ROLNI_QUANTISE_DECODER_MEM(X, N, m) X(H, (m) * (m)) X(G, (m) * (m)) X(B, (m) * (N))
#define ROLNI_QUANTISE_DECODER_WORK(N, m, tape_size) \
    (0 ROLNI_QUANTISE_DECODER_MEM(ROLNI_SIZE, N, m) + \
     ROLN_MAX(ROLNI_QUANTISE_MOMENTS_WORK(m, tape_size), ROLNI_QUANTISE_FIT_WORK(m, N)))
ROLN_FN roln_status rolni_quantise_decoder(const roln_ae *ae, int l, const float *full, const float *z_min, const float *z_max,
                                        float *out, float *work)
{
    const int N = ae->size[l], n = ae->size[l + 1], F = rolni_bends(ae, l) ? ae->monomials : 0, m = n + 1 + F;
    const roln_ae part = rolni_ae_inner(ae, l);
    float *b = out + ROLN_AE_LAYER(ae->storage->bits, N, n) - N;
    roln_status st;
    int k, i;
    ROLNI_QUANTISE_DECODER_MEM(ROLNI_CARVE, N, m)
    rolni_copy(N, full + 2 * n * N, B);
    rolni_copy(n * N, full, B + N);
    rolni_copy(F * N, full + 2 * n * N + N, B + (n + 1) * N);
    for (k = 0; k < F; k++) { /* W -= (W Psi) Phi^T */
        float *w = B + (n + 1 + k) * N;
        roln_mm_bt(1, N, n, w, full + n * N, H);
        for (i = 0; i < n; i++)
            H[i] = -H[i];
        roln_mm_at(1, n, N, H, full, w);
    }
    rolni_quantise_moments(&part, full, out, z_min, z_max, H, G, work);
    if ((st = rolni_quantise_fit(m, N, H, G, B, work)) != ROLN_OK) return st;
    return rolni_quantise_rows(ae->storage, m, N, n, H, B, out, b, work);
}

/* Psi and D of a layer N -> n whose Phi is stored at out, where the layer begins; psi_full: Psi^T as numbers. */
#define ROLNI_QUANTISE_ENCODER_MEM(X, N, n) X(R, (n) * (N)) X(A, (n) * (n)) X(C, (n) * (n))
#define ROLNI_QUANTISE_ENCODER_WORK(N, n) (0 ROLNI_QUANTISE_ENCODER_MEM(ROLNI_SIZE, N, n) + ROLN_INV_WORK(n))
ROLN_FN roln_status rolni_quantise_encoder(const roln_storage *storage, int N, int n, const float *psi_full, float *out,
                                           float *work)
{
    const int matrix = n * ROLN_AE_ROW(storage->bits, N);
    const float most = 1e-2f;
    float *psi = out + matrix, *D = psi + matrix;
    roln_status st;
    int i;
    ROLNI_QUANTISE_ENCODER_MEM(ROLNI_CARVE, N, n)
    if ((st = rolni_quantise_matrix(storage->bits, n, N, psi_full, psi)) != ROLN_OK) return st;
    rolni_read_matrix(storage, n, N, psi, R);
    storage->mm_bt(n, N, n, R, out, A); /* A = Psi^T Phi */
    if ((st = roln_inv(n, A, C, work)) != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        C[i * (n + 1)] -= 1;
    if ((st = rolni_quantise_matrix(storage->bits, n, n, C, D)) != ROLN_OK) return st;
    rolni_read_matrix(storage, n, n, D, C);
    roln_mm(n, n, n, C, A, R);
    for (i = 0; i < n * n; i++) /* R = (I + D) Psi^T Phi - I */
        R[i] += A[i] - ROLNI_AS(float, i % (n + 1) == 0);
    return roln_dot(n * n, R, R) <= most * most ? ROLN_OK : ROLN_E_ILL_CONDITIONED;
}

/* The autoencoder with weights `full` [roln_ae_params of ae with ROLN_FULL], stored as ae says: theta [roln_ae_params(ae)] out,
   untouched unless ROLN_OK. z_min, z_max [n]: where the decoder shall be good, NAME_fit_range. ROLN_E_NOT_FINITE; ROLN_E_RANGE: not
   z_min < z_max, or a weight that no half can hold; ROLN_E_SHAPE: ae has full weights; ROLN_E_ILL_CONDITIONED: what is left of the
   weights has no left inverse, or rounding D leaves it off by |(I + D) Psi^T Phi - I|_F > 1e-2. work [ROLN_AE_QUANTISE_WORK]: out
   is theta to be, and the outermost layer or a bent one takes the most. */
#define ROLNI_AE_QUANTISE_MEM(X, S) X(out, S(ae_size))
#define ROLN_AE_QUANTISE_WORK(S) \
    (S(N1) > 0 ? 0 ROLNI_AE_QUANTISE_MEM(ROLNI_SIZE, S) + \
                     ROLN_MAX(ROLN_MAX(ROLNI_QUANTISE_DECODER_WORK(S(N), S(N1) + 1, 2 * S(ae_sum) + S(monomials)), \
                                       ROLNI_QUANTISE_ENCODER_WORK(S(N), S(N1))), \
                              S(monomials) > 0 ? ROLNI_QUANTISE_DECODER_WORK(S(bent), S(n) + 1 + S(monomials), \
                                                                             2 * S(n) + S(monomials)) : 0) \
               : 0)
ROLN_FN roln_status roln_ae_quantise(const roln_ae *ae, const float *full, const float *z_min, const float *z_max, float *theta,
                                  float *work)
{
    const int ae_size = roln_ae_params(ae), bits = rolni_ae_bits(ae), nz = ae->size[ae->layers];
    roln_status st = ROLN_OK;
    int at = rolni_ae_layers(ae), l, i;
    ROLNI_AE_QUANTISE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (ae->storage == ROLN_FULL) return ROLN_E_SHAPE;
    if (!roln_all_finite(nz, z_min) || !roln_all_finite(nz, z_max)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < nz; i++)
        if (!(z_min[i] < z_max[i])) return ROLN_E_RANGE;
    for (l = 0; l < ae->layers; l++)
        full += ROLN_AE_LAYER(0, ae->size[l], ae->size[l + 1]);
    for (l = ae->layers - 1; l >= 0; l--) {
        const int N = ae->size[l], n = ae->size[l + 1];
        full -= ROLN_AE_LAYER(0, N, n);
        at -= ROLN_AE_LAYER(bits, N, n);
        st = rolni_quantise_decoder(ae, l, full, z_min, z_max, out + at, work);
        if (st == ROLN_OK) st = rolni_quantise_encoder(ae->storage, N, n, full + n * N, out + at, work);
        if (st != ROLN_OK) return st;
    }
    rolni_copy(ae_size, out, theta);
    return ROLN_OK;
}

#endif

/* ---- 9 is it a left inverse? ------------------------------------------------------------------ */

#define ROLN_AE_OFF ROLN_C(1.01e-2)

/* The weights need not lie in an array, so that a file can be looked at before it is taken: the bits of number i of theta. */
typedef roln_bits (*rolni_ae_read)(const void *theta, int i);

/* Weight p of the row that begins at number `row`. */
ROLN_FN roln_real rolni_ae_weight(int bits, rolni_ae_read fetch, const void *theta, int row, int p)
{
#ifndef ROLN_DOUBLE
    if (bits == 8) return rolni_real(fetch(theta, row)) * rolni_from_int8(fetch(theta, row + 1 + p / 4) >> p % 4 * 8);
    if (bits == 16) return rolni_from_half(fetch(theta, row + p / 2) >> p % 2 * 16 << 16);
#endif
    (void)bits;
    return rolni_real(fetch(theta, row + p));
}

/* Entries i, j0 .. j0 + count - 1 of (I + D) Psi^T Phi - I of a layer N -> n, whose Phi begins at number `at`, into e [count]. */
ROLN_FN void rolni_ae_off(int bits, rolni_ae_read fetch, const void *theta, int at, int N, int n, int i, int j0, int count,
                          roln_real *e)
{
    const int row = ROLN_AE_ROW(bits, N), psi = at + n * row, D = psi + n * row + i * ROLN_AE_ROW(bits, n);
    int p, k, j;
    for (j = 0; j < count; j++)
        e[j] = ROLNI_AS(roln_real, i == j0 + j ? -1 : 0);
    for (p = 0; p < N; p++) {
        roln_real x = rolni_ae_weight(bits, fetch, theta, psi + i * row, p);
        for (k = 0; k < n && bits > 0; k++)
            x += rolni_ae_weight(bits, fetch, theta, D, k) * rolni_ae_weight(bits, fetch, theta, psi + k * row, p);
        for (j = 0; j < count; j++)
            e[j] += x * rolni_ae_weight(bits, fetch, theta, at + (j0 + j) * row, p);
    }
}

ROLN_FN roln_status rolni_ae_check(const roln_ae *ae, rolni_ae_read fetch, const void *theta)
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
                rolni_ae_off(bits, fetch, theta, at, N, n, i, j, count, e);
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
   the encoder gives the input u of the decoder's layer back farther off than ROLN_AE_OFF |u|. The bound is that of
   roln_ae_quantise, a hundredth, and a little for sums in another order; training keeps the norm near rounding (of every trained
   model of this repository it is below 2e-6, in float). theta [roln_ae_params] in.
   ROLN_E_ILL_CONDITIONED: a layer is not; ROLN_E_NOT_FINITE: a product is not finite.
   Cost of a layer: n^2 N multiply-adds, of stored weights, which are unpacked one by one, (n / 32 + 1) n^2 N. */
ROLN_FN roln_status roln_ae_check(const roln_ae *ae, const roln_real *theta)
{
    return rolni_ae_check(ae, rolni_ae_bits_at, theta);
}

/* ---- 10 fit a chart --------------------------------------------------------------------------- */

/* The decoder of a bent layer in closed form, from samples that may come one by one, on this machine or on several, and that
   nothing keeps. The layers before it, Psi and b are given. With the features f = [1; z; p(z)] of a sample, m = 1 + n + F numbers,
   and its input v to the layer, the coefficients C = [b; Phi^T; W] [m][N_{L-1}] that make
       sum |v - C^T f|^2 / count + ridge |W|^2
   least solve (G + ridge count I_W) C = h, G = sum f f^T, h = sum f v^T. No constraint is needed: Psi^T v = z + Psi^T b is a linear
   function of the features without p, so that this part of the sum reaches 0, and does so without W, which a ridge would shrink.
   Hence Psi^T Phi = I, Psi^T W^T = 0, and Psi^T b is what it was: z does not change. Numbers that are kept are functions of their
   own z alone, so the fit leaves nothing of them either.

   Sums are double in every build: products of floats are exact there, and so the same bits come out wherever double is IEEE's,
   contracted or not. Where a processor has none it is done in software, on a Cortex-M4F 100 to 150 cycles for each of the
   ROLN_CHART_SUMS and sample. They lie in one flat array, to be zeroed first:
       G by rows, each as far as the diagonal; sums[0] is their count     h [m][N_{L-1}]     sum |v|^2
   Two arrays are merged by adding them, as MPI_Allreduce(.., MPI_SUM) does; a solve leaves them good for more samples. They are
   spent when the encoder changes: by training, roln_chart_center, a new start. */
#define ROLNI_FEATURES(S) (1 + S(n) + S(monomials))
#define ROLN_CHART_SUMS(S) (ROLNI_FEATURES(S) * (ROLNI_FEATURES(S) + 1) / 2 + ROLNI_FEATURES(S) * S(bent) + 1)

/* The weights of the bent layer, ROLN_FULL, of a theta. */
ROLN_FN int rolni_bent_at(const roln_ae *ae)
{
    return rolni_ae_layers(ae) - rolni_ae_layer_size(ae, ae->layers - 1);
}

/* z [nb][n] of nb samples, scale * x [nb][N], by joint divided by each [N] or NULL. Returns the input of the bent layer less b,
   v - b [nb][N_{L-1}], which is on the tape [ROLN_AE_ENCODE_TAPE]. */
ROLN_FN roln_real *rolni_chart_encode(const roln_ae *ae, const roln_real *theta, int nb, const roln_real *x, roln_real scale,
                                      const roln_real *each, roln_real *z, roln_real *tape)
{
    const int n = ae->size[ae->layers], sum = roln_ae_sum(ae);
    roln_real *in = tape + nb * (2 * sum - n); /* x, then x - b_0; of layers behind others the input is an outer side */
    int i;
    for (i = 0; i < nb * ae->size[0]; i++)
        in[i] = scale * x[i];
    for (i = 0; each && i < nb * ae->size[0]; i++)
        in[i] /= each[i % ae->size[0]];
    roln_ae_encode(ae, 1, nb, theta, in, z, tape);
    return ae->layers > 1 ? tape + nb * (2 * (sum - n) - roln_ae_bent(ae)) : in;
}

/* f [m] and v [N_{L-1}] of nb such samples, in double. Returns how many of them come before the first that is not
   finite. work [ROLNI_FEATURES_WORK]. */
#define ROLNI_FEATURES_MEM(X, S, nb) X(z, (nb) * S(n)) X(p, S(monomials)) X(tape, ROLN_AE_ENCODE_TAPE(S, 1, nb))
#define ROLNI_FEATURES_WORK(S, nb) (0 ROLNI_FEATURES_MEM(ROLNI_SIZE, S, nb))
ROLN_FN int rolni_features(const roln_ae *ae, const roln_real *theta, int nb, const roln_real *x, roln_real scale,
                           const roln_real *each, double *f, double *v, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[ae->layers], N1 = ae->size[1], ae_sum = roln_ae_sum(ae), monomials = ae->monomials;
    const int bent = roln_ae_bent(ae);
    const roln_real *in, *b = theta + rolni_bent_at(ae) + 2 * n * bent;
    int r, i;
    ROLNI_FEATURES_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    in = rolni_chart_encode(ae, theta, nb, x, scale, each, z, tape);
    for (r = 0; r < nb; r++, in += bent, v += bent) {
        rolni_polynomials(n, ae->degree, 1, z + r * n, 0, p, 0);
        if (!roln_all_finite(bent, in) || !roln_all_finite(n, z + r * n) || !roln_all_finite(monomials, p)) return r;
        *f++ = 1;
        for (i = 0; i < n; i++)
            *f++ = ROLNI_AS(double, z[r * n + i]);
        for (i = 0; i < monomials; i++)
            *f++ = ROLNI_AS(double, p[i]);
        for (i = 0; i < bent; i++)
            v[i] = ROLNI_AS(double, in[i]) + ROLNI_AS(double, b[i]);
    }
    return nb;
}

/* Adds the count samples scale * x [count][N], by joint divided by each [N] or NULL, to sums [ROLN_CHART_SUMS]. theta in. Samples
   are added in their order, in blocks that do not show in the sums: the same bits as one by one. ROLN_E_NOT_FINITE: the first
   sample that is not finite, or whose features are not, and those behind it are not added; sums[0] tells how many were.
   ROLN_E_SHAPE: no layer is bent, or not ROLN_FULL; ROLN_E_LENGTH: count below 0; then sums are untouched. room
   [ROLN_CHART_ADD_ROOM], work [ROLN_CHART_ADD_WORK]. Cost of a sample: ROLN_CHART_SUMS multiply-adds in double. */
#define ROLN_CHART_BLOCK 8
#define ROLNI_CHART_ADD_MEM(X, m, bent) X(f, ROLN_CHART_BLOCK * (m)) X(v, ROLN_CHART_BLOCK * (bent))
#define ROLN_CHART_ADD_ROOM(S) (0 ROLNI_CHART_ADD_MEM(ROLNI_SIZE, ROLNI_FEATURES(S), S(bent)))
#define ROLN_CHART_ADD_WORK(S) ROLNI_FEATURES_WORK(S, ROLN_CHART_BLOCK)
ROLN_FN roln_status roln_chart_add(const roln_ae *ae, const roln_real *theta, int count, const roln_real *x, roln_real scale,
                                   const roln_real *each, double *sums, double *room, roln_real *work)
{
    const int N = ae->size[0], m = 1 + ae->size[ae->layers] + ae->monomials, bent = roln_ae_bent(ae);
    double *const h = sums + m * (m + 1) / 2, *const vv = h + m * bent;
    int now, good, i;
    ROLNI_CHART_ADD_MEM(ROLNI_CARVE_DOUBLE, m, bent)
    if (ae->monomials == 0 || ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (count < 0) return ROLN_E_LENGTH;
    for (; count > 0; count -= now, x += now * N) {
        double *G = sums;
        now = count < ROLN_CHART_BLOCK ? count : ROLN_CHART_BLOCK;
        good = rolni_features(ae, theta, now, x, scale, each, f, v, work);
        for (i = 0; i < m; i++) {
            rolni_add_rows(good, i + 1, f + i, m, f, m, G);
            rolni_add_rows(good, bent, f + i, m, v, bent, h + i * bent);
            G += i + 1;
        }
        for (i = 0; i < good * bent; i++)
            *vv += v[i] * v[i];
        if (good < now) return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}

/* to += from, sums of other samples for the same theta. size: ROLN_CHART_SUMS. */
ROLN_FN void roln_chart_merge(int size, const double *from, double *to)
{
    int i;
    for (i = 0; i < size; i++)
        to[i] += from[i];
}

/* L D L^T = G of a symmetric G [m][m], rows packed as far as the diagonal, in place; D on the diagonal, of which L is 1.
   ROLN_E_ILL_CONDITIONED: a feature is all but a combination of those before it, a pivot below `least` of its diagonal. */
ROLN_FN roln_status rolni_ldl(int m, double least, double *G)
{
    double *row = G;
    int i, j, k;
    for (i = 0; i < m; row += ++i) {
        const double *other = G;
        double pivot = row[i];
        for (j = 0; j < i; other += ++j) /* L_ij D_j */
            for (k = 0; k < j; k++)
                row[j] -= row[k] * other[k];
        for (other = G, j = 0; j < i; other += ++j) {
            const double t = row[j];
            row[j] = t / other[j];
            pivot -= row[j] * t;
        }
        if (!(pivot > least * row[i])) return ROLN_E_ILL_CONDITIONED;
        row[i] = pivot;
    }
    return ROLN_OK;
}

/* C = (L D L^T)^-1 C, C [m][N]. */
ROLN_FN void rolni_ldl_solve(int m, int N, const double *G, double *C)
{
    const double *row = G;
    int i, j, k;
    for (i = 0; i < m; row += ++i)
        for (k = 0; k < i; k++)
            for (j = 0; j < N; j++)
                C[i * N + j] -= row[k] * C[k * N + j];
    for (row = G, i = 0; i < m; row += ++i)
        for (j = 0; j < N; j++)
            C[i * N + j] /= row[i];
    for (i = m - 1; i > 0; i--) {
        row = G + i * (i + 1) / 2;
        for (k = 0; k < i; k++)
            for (j = 0; j < N; j++)
                C[k * N + j] -= row[k] * C[i * N + j];
    }
}

/* What the coefficients C = [b; Phi^T; W] [m][N] have along Phi is known: Psi^T Phi = I, Psi^T W^T = 0, Psi^T b = Psi^T b_0. Where
   G is nearly singular a solution is off there by features that cancel in C^T f, but not in the decoder, a left inverse. So Phi
   becomes Phi (I - E), where Psi^T Phi = I + E, which leaves E^2, until that is rounding, and b and W lose what they have too much.
   E [n][n] scratch. ROLN_E_ILL_CONDITIONED: some |E_ij| is above 1 / 64. */
ROLN_FN roln_status rolni_chart_polish(int n, int m, int N, const roln_real *psi, const roln_real *b0, double *C, double *E)
{
    double *const phi = C + N;
    int i, j, k, pass;
    for (pass = 0; pass < 4; pass++) {
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                double e = i == j ? -1 : 0;
                for (k = 0; k < N; k++)
                    e += ROLNI_AS(double, psi[i * N + k]) * phi[j * N + k];
                if (!(e <= 0.015625 && e >= -0.015625)) return ROLN_E_ILL_CONDITIONED;
                E[i * n + j] = e;
            }
        for (k = 0; k < N; k++)
            for (j = 0; j < n; j++) /* in place: what that adds is of second order, too */
                for (i = 0; i < n; i++)
                    phi[j * N + k] -= E[i * n + j] * phi[i * N + k];
    }
    for (j = 0; j < m; j = j == 0 ? n + 1 : j + 1) { /* b and W */
        double *row = C + j * N;
        for (i = 0; i < n; i++)
            for (E[i] = 0, k = 0; k < N; k++)
                E[i] += ROLNI_AS(double, psi[i * N + k]) * (row[k] - (j == 0 ? ROLNI_AS(double, b0[k]) : 0));
        for (i = 0; i < n; i++)
            for (k = 0; k < N; k++)
                row[k] -= E[i] * phi[i * N + k];
    }
    return ROLN_OK;
}

/* Numbers that are kept: their columns of C [m][N] lose rounding. b becomes that of the encoder, Phi the inverse of the encoder's
   one number, and W 0. */
ROLN_FN void rolni_chart_keep(int n, int m, int N, int kept, const roln_real *psi, const roln_real *b0, double *C)
{
    int i, j;
    for (i = 0; i < kept; i++) {
        const int z = n - kept + i, x = N - kept + i;
        for (j = 0; j < m; j++)
            C[j * N + x] = 0;
        C[x] = ROLNI_AS(double, b0[x]);
        C[(1 + z) * N + x] = 1 / ROLNI_AS(double, psi[z * N + x]);
    }
}

/* sum |v - mean|^2 from the sums. */
ROLN_FN double rolni_chart_spread(int m, int N, const double *sums)
{
    const double *h = sums + m * (m + 1) / 2;
    double all = h[m * N];
    int i;
    for (i = 0; i < N; i++)
        all -= h[i] / sums[0] * h[i];
    return all;
}

/* What the fit leaves, sqrt(sum |v - C^T f|^2 / sum |v - mean|^2), from the sums and C; penalty: ridge count. It is a difference of
   sums: where next to nothing is left it is their rounding, and 0 where that made it negative. */
ROLN_FN roln_real rolni_chart_residual(int m, int N, int first, double penalty, const double *sums, const double *C)
{
    const double *h = sums + m * (m + 1) / 2;
    double left = h[m * N], W2 = 0;
    int i;
    for (i = 0; i < m * N; i++) {
        left -= C[i] * h[i];
        if (i >= first * N) W2 += C[i] * C[i];
    }
    left -= penalty * W2;
    return left > 0 ? ROLN_SQRT(ROLNI_AS(roln_real, left / rolni_chart_spread(m, N, sums))) : 0;
}

/* Phi, b and W of the bent layer from the sums; Psi and the layers before it stay. theta in and out, residual [1] out
   (rolni_chart_residual), both untouched unless ROLN_OK. ROLN_E_LENGTH: no samples. ROLN_E_ILL_CONDITIONED: too few of them, or too
   few different ones, or they do not fill n dimensions, or the polynomials of so high a degree are not told apart by them: to
   working precision a feature is a combination of others. A ridge helps against the last. ROLN_CHART_RIDGE is usual: it does not
   show in what is left above its root, and keeps W small along all that the samples hardly tell apart. ROLN_E_NOT_FINITE, of ridge
   or sums; ROLN_E_RANGE: ridge below 0; ROLN_E_SHAPE as roln_chart_add.
   room [ROLN_CHART_SOLVE_ROOM]. Cost m^3 / 6 + m^2 N_{L-1}. */
#define ROLN_CHART_RIDGE ROLN_C(1e-10)
#define ROLNI_CHART_SOLVE_MEM(X, m, bent, n) X(G, (m) * ((m) + 1) / 2) X(C, (m) * (bent)) X(E, (n) * (n))
#define ROLN_CHART_SOLVE_ROOM(S) (0 ROLNI_CHART_SOLVE_MEM(ROLNI_SIZE, ROLNI_FEATURES(S), S(bent), S(n)))
ROLN_FN roln_status roln_chart_solve(const roln_ae *ae, const double *sums, roln_real ridge, roln_real *theta,
                                     roln_real *residual, double *room)
{
    const int n = ae->size[ae->layers], m = 1 + n + ae->monomials, bent = roln_ae_bent(ae), at = m * (m + 1) / 2;
    const double noise = 32 * ROLNI_AS(double, ROLN_EPS), least = noise * noise + 1.4e-14 * m; /* of features, and of sums */
    const double penalty = ROLNI_AS(double, ridge) * sums[0];
    roln_real *phi, *b;
    roln_real left;
    roln_status st;
    int i, bad = 0;
    ROLNI_CHART_SOLVE_MEM(ROLNI_CARVE_DOUBLE, m, bent, n)
    if (ae->monomials == 0 || ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (!roln_finite(ridge)) return ROLN_E_NOT_FINITE;
    if (ridge < 0) return ROLN_E_RANGE;
    if (sums[0] < 1) return ROLN_E_LENGTH;
    for (i = 0; i <= at + m * bent; i++)
        bad |= !roln_finite(ROLNI_AS(roln_real, sums[i]));
    if (bad) return ROLN_E_NOT_FINITE;
    memcpy(G, sums, ROLNI_AS(size_t, at) * sizeof *G);
    memcpy(C, sums + at, ROLNI_AS(size_t, m * bent) * sizeof *C);
    for (i = 1 + n; i < m; i++)
        G[i * (i + 3) / 2] += penalty;
    if ((st = rolni_ldl(m, least, G)) != ROLN_OK) return st;
    rolni_ldl_solve(m, bent, G, C);
    left = rolni_chart_residual(m, bent, 1 + n, penalty, sums, C);
    phi = theta + rolni_bent_at(ae), b = phi + 2 * n * bent;
    rolni_chart_keep(n, m, bent, ae->keeps, phi + n * bent, b, C);
    if ((st = rolni_chart_polish(n, m, bent, phi + n * bent, b, C, E)) != ROLN_OK) return st;
    for (i = 0; i < m * bent; i++)
        bad |= !roln_finite(ROLNI_AS(roln_real, C[i]));
    if (bad || !roln_finite(left)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < bent; i++)
        b[i] = ROLNI_AS(roln_real, C[i]);
    for (i = 0; i < n * bent; i++)
        phi[i] = ROLNI_AS(roln_real, C[bent + i]);
    for (i = 0; i < ae->monomials * bent; i++)
        b[bent + i] = ROLNI_AS(roln_real, C[(1 + n) * bent + i]);
    *residual = left;
    return ROLN_OK;
}

/* Nonzero if rolni_stretch would leave finite numbers. */
ROLN_FN int rolni_stretches(int N, int n, const roln_real *z_min, const roln_real *z_max, const roln_real *layer)
{
    const roln_real *phi = layer, *psi = phi + n * N, *b = psi + n * N;
    int i, j, bad = 0;
    for (j = 0; j < N; j++) {
        roln_real sum = b[j];
        for (i = 0; i < n; i++) {
            sum += (z_max[i] / 2 + z_min[i] / 2) * phi[i * N + j];
            bad |= !roln_finite(psi[i * N + j] / (z_max[i] / 2 - z_min[i] / 2));
        }
        bad |= !roln_finite(sum);
    }
    return !bad;
}

/* Coordinates of a bent layer in which z_min .. z_max [n] of today become -1 .. 1, and W = 0: what a chart needs before its sums.
   theta is untouched unless ROLN_OK. ROLN_E_NOT_FINITE: the range, or a weight behind it; ROLN_E_RANGE: not z_min < z_max;
   ROLN_E_ILL_CONDITIONED: along some coordinate the range is as narrow, |Phi_i| (z_max - z_min), as the rounding of another one;
   ROLN_E_SHAPE as roln_chart_add. */
ROLN_FN roln_status roln_chart_center(const roln_ae *ae, const roln_real *z_min, const roln_real *z_max, roln_real *theta)
{
    const int n = ae->size[ae->layers], N = roln_ae_bent(ae);
    roln_real *layer, widest = 0;
    int i, pass;
    if (ae->monomials == 0 || ae->storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (!roln_all_finite(n, z_min) || !roln_all_finite(n, z_max)) return ROLN_E_NOT_FINITE;
    layer = theta + rolni_bent_at(ae);
    for (pass = 0; pass < 2; pass++)
        for (i = 0; i < n; i++) {
            const roln_real half = z_max[i] / 2 - z_min[i] / 2;
            const roln_real wide = half * ROLN_SQRT(roln_dot(N, layer + i * N, layer + i * N));
            if (!(half > 0)) return ROLN_E_RANGE;
            if (!roln_finite(wide)) return ROLN_E_NOT_FINITE;
            if (pass == 0) widest = wide > widest ? wide : widest;
            else if (!(wide > 64 * ROLN_EPS * widest)) return ROLN_E_ILL_CONDITIONED;
        }
    if (!rolni_stretches(N, n, z_min, z_max, layer)) return ROLN_E_NOT_FINITE;
    rolni_stretch(N, n, ae->monomials, z_min, z_max, layer);
    return ROLN_OK;
}

/* How the fit changes with the encoder. theta: as roln_chart_solve left it, from sums of all samples, of which x [nb][N] is a part.
   With e = C^T f - v it adds sum |e|^2 to *sum and the derivative of that by Psi^T, with b and C as they are, to gpsi:
       2 sum g_z (v - b)^T  [n][N_{L-1}],   g_z = (df/dz)^T C e
   Over all samples it is also the derivative of the least sum, since at C a change of C counts nothing (variable projection, Golub
   and Pereyra 1973). NaN passes through. work [ROLN_CHART_GRAD_WORK]. Cost of a sample about 3 F N_{L-1} multiply-adds. */
#define ROLN_CHART_GRAD_MEM(X, S, nb) \
    X(e, (nb) * S(bent)) X(gz, (nb) * S(n)) X(tape, ROLN_AE_ENCODE_TAPE(S, 1, nb)) X(s, (nb) * (2 * S(n) + S(monomials)))
#define ROLN_CHART_GRAD_WORK(S, nb) \
    (0 ROLN_CHART_GRAD_MEM(ROLNI_SIZE, S, nb) + ROLNI_BENT_BACK_WORK(nb, S(bent), S(monomials)))
ROLN_FN void roln_chart_grad(const roln_ae *ae, const roln_real *theta, int nb, const roln_real *x, roln_real scale, double *sum,
                             roln_real *gpsi, roln_real *work)
{
    const int N = ae->size[0], n = ae->size[ae->layers], N1 = ae->size[1], ae_sum = roln_ae_sum(ae), monomials = ae->monomials;
    const int bent = roln_ae_bent(ae);
    const roln_real *layer = theta + rolni_bent_at(ae), *in;
    int i;
    ROLN_CHART_GRAD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    in = rolni_chart_encode(ae, theta, nb, x, scale, NULL, s + nb * (n + monomials), tape); /* z to where the decoder has it */
    ae->bend->decode(ae, 1, nb, layer, s, e);
    for (i = 0; i < nb * bent; i++) {
        e[i] -= in[i];
        *sum += ROLNI_AS(double, e[i]) * ROLNI_AS(double, e[i]);
    }
    ae->bend->bwd(ae, 1, nb, layer, s, e, NULL, gz, work);
    for (i = 0; i < nb * n; i++)
        gz[i] *= 2;
    roln_mm_at(n, nb, bent, gz, in, gpsi);
}

#endif
