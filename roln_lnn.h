/* roln_lnn.h - Lagrangian neural network: a learned mass matrix, potential and dissipation, and the motion they imply.

       M(z) zdd + C(z,zd) zd + g(z) + R(z) zd = tau_z        M = exp_P(U(z)),  g = dV/dz,  R = L L^T

   u, V and L are multilayer perceptrons of z, U the symmetric matrix filled from u, exp_P the exponential map at the base
   point P, so M is positive definite whatever the weights. Behind the exponential SPD layers may follow; or M = L L^T + eps I
   (Cholesky, as in DeLaN) takes its place. C comes from the Christoffel symbols of M:

       c = C zd = DM[zd] zd - 1/2 grad_z (zd^T M zd)

   one directional derivative and one gradient; neither dM/dz nor, with the exponential, M^-1 is ever formed.
   After Friedl et al., ICLR 2025, Eqs. 4-8 and section 3.1; [ours] in the form of c and of its backward.

   1 perceptron     2 shape and layout     3 mass matrix     4 mechanics     5 backward     6 integrators

   Samples come in blocks of nb rows, state s = [z; zd] as [2][nb][n]. Forward functions fill a tape; backward functions
   read the tape, add to their outputs and skip those that are NULL. Complete without roln.h. */

#ifndef ROLN_LNN_H
#define ROLN_LNN_H

#include "roln_spd.h"

/* ---- 1 perceptron ----------------------------------------------------------------------------- */

#define ROLN_MLP_MAX 6 /* layers at most, the linear output layer included */

/* Fully connected network with softplus between its layers and a linear output. */
typedef struct {
    int layers;
    int size[ROLN_MLP_MAX + 1]; /* input, hidden .., output */
} roln_mlp;

/* theta holds for each layer W and b. W is [in][out] in hidden layers and [out][in] in the output layer: the wide,
   hidden side is contiguous. */
ROLN_FN int roln_mlp_params(const roln_mlp *f)
{
    int l, sum = 0;
    for (l = 0; l < f->layers; l++)
        sum += (f->size[l] + 1) * f->size[l + 1];
    return sum;
}

/* Sum of the hidden sizes. */
ROLN_FN int roln_mlp_hidden(const roln_mlp *f)
{
    int l, sum = 0;
    for (l = 1; l < f->layers; l++)
        sum += f->size[l];
    return sum;
}

/* The planes t .. t+k-1 of a block: plane 0 the values y = f(x), 1 .. T the directional derivatives y_t = Df(x)[x_t], which
   plane 0 must precede. x [1+T][nb][in], theta in; y [1+T][nb][out] (those planes written),
   tape [ROLN_MLP_TAPE]: per hidden layer the slopes softplus'(a) and the outputs of all planes. */
#define ROLN_MLP_TAPE(T, nb, hidden) ((2 + (T)) * (nb) * (hidden))
ROLN_FN void roln_mlp_forward(const roln_mlp *f, int T, int t, int k, int nb, const roln_real *theta, const roln_real *x,
                              roln_real *y, roln_real *tape)
{
    const roln_real *in = x + t * nb * f->size[0];
    int l, r, i, p;
    for (l = 0; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1], m = nb * no, last = l + 1 == f->layers;
        const roln_real *b = theta + ni * no;
        roln_real *s = tape, *out = (last ? y : s + m) + t * m;
        if (last) roln_mm_bt(k * nb, ni, no, in, theta, out);
        else roln_mm(k * nb, ni, no, in, theta, out);
        for (r = 0; r < nb && t == 0; r++)
            for (i = 0; i < no; i++)
                out[r * no + i] += b[i];
        if (!last && t == 0) roln_softplus_n(m, out, out, s);
        for (p = t == 0; p < k && !last; p++)
            for (i = 0; i < m; i++)
                out[p * m + i] *= s[i];
        theta = b + no;
        tape += (2 + T) * m;
        in = out;
    }
}

/* Backward of the first `planes` planes (1 + T or fewer). gy [planes][nb][out] in; adds to gx [planes][nb][in] and
   gtheta (each may be NULL). work [ROLN_MLP_BWD_WORK], wide = the largest of the input and hidden sizes. */
#define ROLN_MLP_BWD_WORK(planes, nb, wide) (2 * (planes) * (nb) * (wide))
ROLN_FN void roln_mlp_bwd(const roln_mlp *f, int T, int planes, int nb, const roln_real *theta, const roln_real *x,
                          const roln_real *tape, const roln_real *gy, roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const int rows = planes * nb;
    const roln_real *g = gy, *th = theta + roln_mlp_params(f), *tp = tape + ROLN_MLP_TAPE(T, nb, roln_mlp_hidden(f));
    roln_real *ga = work, *gn;
    int l, r, i, t, wide = f->size[0];
    for (l = 1; l < f->layers; l++)
        wide = f->size[l] > wide ? f->size[l] : wide;
    gn = work + rows * wide;
    for (l = f->layers - 1; l >= 0; l--) {
        const int ni = f->size[l], no = f->size[l + 1], last = l + 1 == f->layers;
        const roln_real *b = th - no, *W = b - ni * no;
        const roln_real *in = l > 0 ? tp - (1 + T) * nb * ni : x; /* outputs of the layer below */
        if (gtheta) {
            roln_real *gb = gtheta + (b - theta), *gW = gtheta + (W - theta);
            if (last) roln_mm_at(no, rows, ni, g, in, gW);
            else roln_mm_at(ni, rows, no, in, g, gW);
            for (r = 0; r < nb; r++)
                for (i = 0; i < no; i++)
                    gb[i] += g[r * no + i];
        }
        if (l == 0 && !gx) break;
        if (last) roln_mm(rows, no, ni, g, W, gn);
        else roln_mm_bt(rows, no, ni, g, W, gn);
        if (l > 0) { /* y = softplus(a), y_t = s a_t, s' = s (1 - s): ga = s gy + (1 - s) sum_t gy_t y_t, ga_t = s gy_t */
            const roln_real *s = in - nb * ni;
            const int m = nb * ni;
            for (i = 0; i < m; i++)
                gn[i] *= s[i];
            for (t = 1; t < planes; t++)
                for (i = 0; i < m; i++) {
                    gn[i] += (1 - s[i]) * gn[t * m + i] * in[t * m + i];
                    gn[t * m + i] *= s[i];
                }
            tp = s;
        }
        g = gn, gn = ga, ga = work + (g == work ? 0 : rows * wide);
        th = W;
    }
    for (i = 0; gx && i < rows * f->size[0]; i++)
        gx[i] += g[i];
}

/* Random weights: xavier-normal, gain sqrt 2 in hidden layers, `out` in the output layer, biases 0. */
ROLN_FN void roln_mlp_init(const roln_mlp *f, roln_real out, roln_real *theta, uint64_t *seed)
{
    int l, i;
    for (l = 0; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1];
        const roln_real gain = l + 1 < f->layers ? 2 : out * out, sd = ROLN_SQRT(gain * 2 / (roln_real)(ni + no));
        for (i = 0; i < ni * no; i++)
            *theta++ = sd * roln_normal(seed);
        for (i = 0; i < no; i++)
            *theta++ = 0;
    }
}

/* ---- 2 shape and layout ----------------------------------------------------------------------- */

/* Number of entries of u: the lower triangle of a symmetric or triangular matrix. */
#define ROLN_TRI(n) ((n) * ((n) + 1) / 2)

#define ROLN_LAYERS_MAX 4 /* SPD layers at most */

enum { ROLN_EXPONENTIAL = 0, ROLN_CHOLESKY = 1 };       /* heads: how u becomes a mass matrix */
enum { ROLN_GYRO = 1, ROLN_REEIG = 2, ROLN_BIMAP = 3 }; /* SPD layers, see section 3 */

/* Shape of a Lagrangian network; all its perceptrons have the same hidden sizes. */
typedef struct {
    int n;                          /* degrees of freedom */
    int head;                       /* ROLN_EXPONENTIAL: X_0 = exp_P(U); ROLN_CHOLESKY: M = L L^T + least I */
    int base;                       /* exponential: 0: base point I, 1: learned P */
    int layers;                     /* SPD layers behind the exponential: X_i+1 = layer_i(X_i), the last is M */
    int layer[ROLN_LAYERS_MAX];     /* ROLN_GYRO, ROLN_REEIG keep the width; ROLN_BIMAP: width[i+1] <= width[i] */
    int width[ROLN_LAYERS_MAX + 1]; /* of X_0 (and U, P), .. X_layers; the last is n */
    int damping;                    /* 1: learned dissipation R(z) = L L^T */
    roln_real least;                /* smallest eigenvalue that ROLN_CHOLESKY adds and ROLN_REEIG lets through */
    roln_mlp mass;                  /* z -> u, ROLN_TRI(width[0]) outputs */
    roln_mlp potential;             /* z -> V, one output */
    roln_mlp damper;                /* z -> L, ROLN_TRI(n) outputs */
} roln_lnn;

/* theta holds the networks (mass, potential and, if damping, damper), P if base, and the SPD layers: ROLN_GYRO the
   triangle of W, then B [w][w]; ROLN_BIMAP W^T [width[i+1]][width[i]]. Where they begin: */
ROLN_FN int rolni_damper_at(const roln_lnn *f)
{
    return roln_mlp_params(&f->mass) + roln_mlp_params(&f->potential);
}

ROLN_FN int rolni_base_at(const roln_lnn *f)
{
    return rolni_damper_at(f) + (f->damping ? roln_mlp_params(&f->damper) : 0);
}

ROLN_FN int rolni_layer_at(const roln_lnn *f, int layer)
{
    int at = rolni_base_at(f) + (f->base ? f->width[0] * f->width[0] : 0), i;
    for (i = 0; i < layer; i++) {
        const int w = f->width[i];
        if (f->layer[i] == ROLN_GYRO) at += ROLN_TRI(w) + w * w;
        if (f->layer[i] == ROLN_BIMAP) at += f->width[i + 1] * w;
    }
    return at;
}

ROLN_FN int roln_lnn_params(const roln_lnn *f)
{
    return rolni_layer_at(f, f->layers);
}

/* Random networks with small outputs, so that M is near I (and P = I), R near 0. Gyro layers start as the identity (W = 1,
   B = I), BiMap as the leading block (W = [I; 0]). */
ROLN_FN void roln_lnn_init(const roln_lnn *f, roln_real *theta, uint64_t *seed)
{
    roln_real *th = theta + rolni_base_at(f);
    int i, j, w = f->width[0];
    roln_mlp_init(&f->mass, ROLN_C(0.1), theta, seed);
    if (f->head == ROLN_CHOLESKY)
        for (i = 0; i < f->n; i++) /* L = I */
            theta[roln_mlp_params(&f->mass) - ROLN_TRI(f->n) + i] = 1;
    roln_mlp_init(&f->potential, 1, theta + roln_mlp_params(&f->mass), seed);
    if (f->damping) roln_mlp_init(&f->damper, ROLN_C(0.1), theta + rolni_damper_at(f), seed);
    for (j = 0; f->base && j < w * w; j++)
        *th++ = j % (w + 1) == 0;
    for (i = 0; i < f->layers; i++) {
        w = f->width[i];
        for (j = 0; f->layer[i] == ROLN_GYRO && j < ROLN_TRI(w); j++)
            *th++ = 1;
        for (j = 0; f->layer[i] == ROLN_GYRO && j < w * w; j++)
            *th++ = j % (w + 1) == 0;
        for (j = 0; f->layer[i] == ROLN_BIMAP && j < f->width[i + 1] * w; j++)
            *th++ = j % (w + 1) == 0;
    }
}

/* Nonzero if M itself is kept; else M = exp_P(U) is used from the eigenbasis of U and never formed. */
ROLN_FN int rolni_formed(const roln_lnn *f)
{
    return f->layers > 0 || f->head == ROLN_CHOLESKY;
}

/* The tape of a block, for T directions: 1 serves the forward pass (zd), 2 also the backward (one more), 3 the backward of
   roln_lnn_inverse with a velocity of its own. m = width[0]. Where things lie: */
typedef struct {
    roln_real *x;      /* [1+T][nb][n]   z, directions, zd last */
    roln_real *u;      /* [1+T][nb][tri] mass network */
    roln_real *mass;   /*                its tape */
    roln_real *v;      /* [2][nb]        potential, and in direction 1 */
    roln_real *pot;    /*                its tape */
    roln_real *L;      /* [nb][tri]      damper */
    roln_real *damp;   /*                its tape */
    roln_real *kin;    /* [nb][n]        1/2 grad_z (zd^T M w), w = zd unless asked for */
    roln_real *g;      /* [nb][n]        dV/dz */
    roln_real *dmv;    /* [nb][n]        DM[zd] w */
    roln_real *d;      /* [nb][n]        R zd, 0 without damping */
    roln_real *zdd;    /* [nb][n] */
    roln_real *l;      /* [nb][m]        eigenvalues of A^-1 U A^-T */
    roln_real *el;     /* [nb][m]        e^-l */
    roln_real *Q;      /* [nb][m][m]     X_0 = Q^T e^l Q; Cholesky head: L */
    roln_real *R;      /* [nb][m][m]     X_0^-1 = R^T e^-l R, Q R^T = I; R is Q where P = I */
    roln_real *K;      /* [nb][m][m]     exp[l_i, l_j] */
    roln_real *M, *C;  /* [nb][n][n]     M and its Cholesky factor, where M is formed */
    roln_real *A;      /* [m][m]         Cholesky factor of P */
} rolni_tape;

/* Numbers on a tape. m: width[0]; formed: 1 with SPD layers or the Cholesky head; hidden: sum of the hidden sizes. */
#define ROLN_LNN_TAPE(n, m, base, formed, damping, hidden, T, nb) \
    ((nb) * ((1 + (T)) * ((n) + ROLN_TRI(m)) + 2 + 5 * (n) + 2 * (m) + (2 + (base)) * (m) * (m) + 2 * (formed) * (n) * (n) + \
             (damping) * ROLN_TRI(n)) + (base) * (m) * (m) + ROLN_MLP_TAPE(T, nb, hidden) + \
     ROLN_MLP_TAPE((T) > 1, nb, hidden) + (damping) * ROLN_MLP_TAPE(0, nb, hidden))

/* Work of rolni_eval and rolni_adjoint on such a tape, hence of every function below that names it. layers: SPD layers;
   wide: the largest of n and the hidden sizes. */
#define ROLNI_LAYER_MEM(w, T) (4 * (w) + (6 + 4 * (T)) * (w) * (w))
#define ROLNI_CHAIN(m, layers, T) ((1 + (T)) * (m) * (m) + (layers) * (ROLNI_LAYER_MEM(m, T) + (1 + (T)) * (m) * (m)))
#define ROLNI_HEAD_WORK(m, layers, formed, T) \
    ((5 + 2 * (T)) * (m) * (m) + 4 * (m) + ROLN_EIG_WORK(m) + ((T) > 1) * (m) * (m) * (m) + \
     (formed) * (ROLNI_CHAIN(m, layers, T) + (1 + (T)) * (m) * (m)))
#define ROLN_LNN_WORK(n, m, layers, formed, wide, T, nb) \
    ((nb) * ((1 + (T)) * (ROLN_TRI(m) + (n)) + 2 + ROLN_TRI(n)) + \
     ROLN_MAX(ROLN_MLP_BWD_WORK(1 + (T), nb, wide), ROLNI_HEAD_WORK(m, layers, formed, T)))

/* The first at run time. */
ROLN_FN int roln_lnn_tape(const roln_lnn *f, int T, int nb)
{
    return ROLN_LNN_TAPE(f->n, f->width[0], f->base, rolni_formed(f), f->damping, roln_mlp_hidden(&f->mass), T, nb);
}

ROLN_FN rolni_tape rolni_tape_of(const roln_lnn *f, int T, int nb, roln_real *mem)
{
    const int n = f->n, m = f->width[0], h = roln_mlp_hidden(&f->mass), formed = rolni_formed(f);
    rolni_tape t;
    t.x = mem;
    t.u = t.x + (1 + T) * nb * n;
    t.mass = t.u + (1 + T) * nb * ROLN_TRI(m);
    t.v = t.mass + ROLN_MLP_TAPE(T, nb, h);
    t.pot = t.v + 2 * nb;
    t.L = t.pot + ROLN_MLP_TAPE(T > 1, nb, h);
    t.damp = t.L + f->damping * nb * ROLN_TRI(n);
    t.kin = t.damp + f->damping * ROLN_MLP_TAPE(0, nb, h);
    t.g = t.kin + nb * n;
    t.dmv = t.g + nb * n;
    t.d = t.dmv + nb * n;
    t.zdd = t.d + nb * n;
    t.l = t.zdd + nb * n;
    t.el = t.l + nb * m;
    t.Q = t.el + nb * m;
    t.K = t.Q + nb * m * m;
    t.R = f->base ? t.K + nb * m * m : t.Q;
    t.M = t.K + (1 + f->base) * nb * m * m;
    t.C = t.M + formed * nb * n * n;
    t.A = t.C + formed * nb * n * n;
    return t;
}

/* ---- 3 mass matrix ---------------------------------------------------------------------------- */

/* U = the symmetric matrix of u: diagonal first, then the strict lower triangle row by row. */
ROLN_FN void rolni_sym(int n, const roln_real *u, roln_real *U)
{
    int i, j;
    for (i = 0; i < n; i++)
        U[i * n + i] = *u++;
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            U[i * n + j] = U[j * n + i] = *u++;
}

/* gu = diag G_ii, low G_ij in the order of u: the cotangent of u where G is that of a symmetric (1, 2) or of a triangular
   matrix (1, 1). */
ROLN_FN void rolni_tri_bwd(int n, roln_real diag, roln_real low, const roln_real *G, roln_real *gu)
{
    int i, j;
    for (i = 0; i < n; i++)
        *gu++ = diag * G[i * n + i];
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            *gu++ = low * G[i * n + j];
}

/* L = the lower triangular matrix of u, in the same order, zeros above. */
ROLN_FN void rolni_low(int n, const roln_real *u, roln_real *L)
{
    int i, j;
    memset(L, 0, (size_t)(n * n) * sizeof *L);
    for (i = 0; i < n; i++)
        L[i * n + i] = *u++;
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            L[i * n + j] = *u++;
}

/* Y = Q^T X Q. work [n][n]. */
ROLN_FN void rolni_congr_t_set(int n, const roln_real *Q, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_mm(n, n, n, X, Q, work);
    memset(Y, 0, (size_t)(n * n) * sizeof *Y);
    roln_mm_at(n, n, n, Q, work, Y);
}

/* Y = X + X^T. */
ROLN_FN void rolni_twice_sym(int n, const roln_real *X, roln_real *Y)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            Y[i * n + j] = X[i * n + j] + X[j * n + i];
}

/* Z = c sym(p q^T). */
ROLN_FN void rolni_outer(int n, roln_real c, const roln_real *p, const roln_real *q, roln_real *Z)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            Z[i * n + j] = c / 2 * (p[i] * q[j] + q[i] * p[j]);
}

/* y = Q^T ((K o F) p): the symmetric matrix Q^T (K o F) Q applied to the vector with p = Q x. work [n]. */
ROLN_FN void rolni_apply(int n, const roln_real *Q, const roln_real *K, const roln_real *F, const roln_real *p,
                         roln_real *y, roln_real *work)
{
    int i, j;
    for (i = 0; i < n; i++) {
        roln_real s = 0;
        for (j = 0; j < n; j++)
            s += K[i * n + j] * F[i * n + j] * p[j];
        work[i] = s;
    }
    roln_mm(1, n, n, work, Q, y);
}

/* Spectral functions Y = f(X) = Q^T f(l) Q with k directions X_t, planes [1+k][n][n]:
       F_t = Q X_t Q^T,   Y_t = Q^T (K o F_t) Q,   K_ij = f[l_i, l_j],   T_ijk = f[l_i, l_j, l_k] */
enum { ROLNI_CUT = -1 }; /* f = max(least, .), beside ROLN_EXP and ROLN_LOG */

typedef struct {
    roln_real *l, *f, *Q, *K, *F;
} rolni_spectrum;

/* f and K of the ascending l. log: within what exp can hold, for T is made of its differences. */
ROLN_FN roln_status rolni_dd1(int kind, int n, roln_real least, const roln_real *l, roln_real *f, roln_real *K)
{
    roln_status st;
    int i, j;
    if (kind == ROLNI_CUT) {
        for (i = 0; i < n; i++)
            for (f[i] = l[i] > least ? l[i] : least, j = 0; j <= i; j++)
                K[i * n + j] = K[j * n + i] = !(l[i] > least) ? 0 : l[j] >= least ? 1 : (l[i] - least) / (l[i] - l[j]);
        return ROLN_OK;
    }
    if ((st = roln_map_values(n, kind, 0, l, f)) != ROLN_OK) return st;
    if (kind == ROLN_LOG && (st = roln_exp_range(n, f)) != ROLN_OK) return st;
    roln_map_dd1(n, kind, 0, l, f, K);
    return ROLN_OK;
}

/* T. log: differentiating exp(log X) = X twice, T_ijk = - exp[f_i, f_j, f_k] K_ij K_jk K_ik. work [n][n]. */
ROLN_FN void rolni_dd2(int kind, int n, roln_real least, const roln_real *l, const roln_real *f, const roln_real *K,
                       roln_real *T, roln_real *work)
{
    int i, j, k;
    if (kind == ROLN_EXP) {
        roln_exp_dd2(n, l, K, T);
        return;
    }
    if (kind == ROLN_LOG) {
        roln_exp_dd1(n, f, work);
        roln_exp_dd2(n, f, work, T);
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (k = 0; k < n; k++) {
                roln_real *x = T + (i * n + j) * n + k;
                if (kind == ROLN_LOG) {
                    *x *= -(K[i * n + j] * K[j * n + k] * K[i * n + k]);
                } else { /* one of the three on the other side of `least` than the two: its distance / (gap gap) */
                    const roln_real a = l[i], b = l[j], c = l[k];
                    const int up = (a > least) + (b > least) + (c > least);
                    const roln_real o = (a > least) == (up == 1) ? a : (b > least) == (up == 1) ? b : c;
                    const roln_real p = o == a ? b : a, q = o == c ? b : c;
                    *x = up % 3 == 0 ? 0 : ROLN_ABS(o - least) / (ROLN_ABS(o - p) * ROLN_ABS(o - q));
                }
            }
}

/* In the eigenbasis, in place: the cotangents Z_t of the planes of Y become those of X,
       D_0 = K o Z_0 + sum_t D2f[F_t, Z_t],   D_t = K o Z_t. */
ROLN_FN void rolni_spectral_eig_bwd(int n, int k, const roln_real *K, const roln_real *T, const roln_real *F, roln_real *Z)
{
    const int nn = n * n;
    int t, i;
    for (i = 0; i < nn; i++)
        Z[i] *= K[i];
    for (t = 1; t <= k; t++) {
        roln_exp_d2(n, T, F + (t - 1) * nn, Z + t * nn, Z);
        for (i = 0; i < nn; i++)
            Z[t * nn + i] *= K[i];
    }
}

/* Forward; s keeps what the backward needs. work [2 n n + ROLN_EIG_WORK(n)]. */
ROLN_FN roln_status rolni_spectral(int kind, int n, int k, roln_real least, const roln_real *X, const rolni_spectrum *s,
                                   roln_real *Y, roln_real *work)
{
    const int nn = n * n;
    roln_status st;
    int t, i;
    if ((st = roln_eig(n, X, s->l, s->Q, work)) != ROLN_OK) return st;
    if ((st = rolni_dd1(kind, n, least, s->l, s->f, s->K)) != ROLN_OK) return st;
    roln_spd_form(n, s->f, s->Q, Y, work);
    for (t = 1; t <= k; t++) {
        roln_real *F = s->F + (t - 1) * nn;
        roln_congr(n, s->Q, X + t * nn, F, work);
        for (i = 0; i < nn; i++)
            work[i] = s->K[i] * F[i];
        rolni_congr_t_set(n, s->Q, work, Y + t * nn, work + nn);
    }
    return ROLN_OK;
}

/* Backward: the cotangents G [1+k][n][n] of Y become those of X. work [2 n n + n n n]. */
ROLN_FN void rolni_spectral_bwd(int kind, int n, int k, roln_real least, const rolni_spectrum *s, roln_real *G, roln_real *work)
{
    const int nn = n * n;
    roln_real *tmp = work, *D = tmp + nn, *T = D + nn;
    int t;
    for (t = 0; t <= k; t++)
        roln_congr(n, s->Q, G + t * nn, G + t * nn, tmp);
    if (k > 0) rolni_dd2(kind, n, least, s->l, s->f, s->K, T, tmp);
    rolni_spectral_eig_bwd(n, k, s->K, T, s->F, G);
    for (t = 0; t <= k; t++) {
        memcpy(D, G + t * nn, (size_t)nn * sizeof *D);
        rolni_congr_t_set(n, s->Q, D, G + t * nn, tmp);
    }
}

/* SPD layers (paper, section 3.1), on planes X [1+k][w][w] -> Y [1+k][wo][wo], mem [ROLNI_LAYER_MEM(w, T)]:
       gyro     Y = E B E, E = exp(1/2 W o log X): gyro-translation by the SPD bias B of the matrix scaling of X by W
       ReEig    Y = max(least, X), on the eigenvalues
       BiMap    Y = W^T X W, W^T W = I
   Eigenvalues of X of the gyro layer within what exp can hold, else ROLN_E_RANGE or ROLN_E_NOT_SPD. */
typedef struct {
    rolni_spectrum a, b; /* of log and exp; ReEig: a */
    roln_real *L, *E;    /* log X, exp(1/2 W o log X) [1+k][w][w] */
} rolni_layer_mem;

ROLN_FN rolni_layer_mem rolni_layer_mem_of(int w, int T, roln_real *mem)
{
    rolni_layer_mem m;
    m.a.l = mem, m.a.f = m.a.l + w, m.a.Q = m.a.f + w, m.a.K = m.a.Q + w * w, m.a.F = m.a.K + w * w;
    m.b.l = m.a.F + T * w * w, m.b.f = m.b.l + w, m.b.Q = m.b.f + w, m.b.K = m.b.Q + w * w, m.b.F = m.b.K + w * w;
    m.L = m.b.F + T * w * w, m.E = m.L + (1 + T) * w * w;
    return m;
}

ROLN_FN roln_status rolni_layer(const roln_lnn *f, int i, int T, int k, const roln_real *theta, const roln_real *X,
                                roln_real *Y, roln_real *mem, roln_real *work)
{
    const int w = f->width[i], wo = f->width[i + 1], ww = w * w;
    const rolni_layer_mem m = rolni_layer_mem_of(w, T, mem);
    const roln_real *B = theta + ROLN_TRI(w);
    roln_status st;
    int t, j;
    if (f->layer[i] == ROLN_REEIG) return rolni_spectral(ROLNI_CUT, w, k, f->least, X, &m.a, Y, work);
    if (f->layer[i] == ROLN_BIMAP) {
        for (t = 0; t <= k; t++) {
            roln_mm(wo, w, w, theta, X + t * ww, work);
            roln_mm_bt(wo, w, wo, work, theta, Y + t * wo * wo);
        }
        return ROLN_OK;
    }
    if ((st = rolni_spectral(ROLN_LOG, w, k, 0, X, &m.a, m.L, work)) != ROLN_OK) return st;
    rolni_sym(w, theta, work);
    for (t = 0; t <= k; t++)
        for (j = 0; j < ww; j++)
            Y[t * ww + j] = work[j] * m.L[t * ww + j] / 2;
    if ((st = rolni_spectral(ROLN_EXP, w, k, 0, Y, &m.b, m.E, work)) != ROLN_OK) return st;
    roln_congr(w, m.E, B, Y, work);
    for (t = 1; t <= k; t++) { /* E_t B E and its transpose */
        roln_mm(w, w, w, m.E + t * ww, B, work);
        roln_mm(w, w, w, work, m.E, work + ww);
        rolni_twice_sym(w, work + ww, Y + t * ww);
    }
    return ROLN_OK;
}

/* Backward of rolni_layer: the cotangents G of Y become those of X; gtheta added to (may be NULL).
   work [(5 + k) w w + w w w]. */
ROLN_FN void rolni_layer_bwd(const roln_lnn *f, int i, int T, int k, const roln_real *theta, const roln_real *X, roln_real *G,
                             roln_real *gtheta, roln_real *mem, roln_real *work)
{
    const int w = f->width[i], wo = f->width[i + 1], ww = w * w;
    const rolni_layer_mem m = rolni_layer_mem_of(w, T, mem);
    const roln_real *B = theta + ROLN_TRI(w);
    roln_real *S = work, *tmp = S + ww, *gE = tmp + ww, *rest = gE + (1 + k) * ww;
    int t, j;
    if (f->layer[i] == ROLN_REEIG) {
        rolni_spectral_bwd(ROLNI_CUT, w, k, f->least, &m.a, G, work);
        return;
    }
    if (f->layer[i] == ROLN_BIMAP) {
        for (t = 0; t <= k; t++) { /* W G W^T; g_W^T = 2 G W^T X */
            roln_mm(wo, wo, w, G + t * wo * wo, theta, tmp);
            if (gtheta) {
                roln_mm(wo, w, w, tmp, X + t * ww, S);
                for (j = 0; j < wo * w; j++)
                    gtheta[j] += 2 * S[j];
            }
            memset(gE + t * ww, 0, (size_t)ww * sizeof *gE);
            roln_mm_at(w, wo, w, theta, tmp, gE + t * ww);
        }
        memcpy(G, gE, (size_t)((1 + k) * ww) * sizeof *G);
        return;
    }
    for (t = 0; t <= k; t++) { /* Y_t: cotangents of E_t, and of E */
        roln_mm(w, w, w, m.E, B, tmp);
        roln_mm(w, w, w, G + t * ww, tmp, S);
        rolni_twice_sym(w, S, gE + t * ww);
        if (t == 0) continue;
        roln_mm(w, w, w, m.E + t * ww, B, tmp);
        roln_mm(w, w, w, G + t * ww, tmp, S);
        rolni_twice_sym(w, S, tmp);
        for (j = 0; j < ww; j++)
            gE[j] += tmp[j];
    }
    for (t = 0; gtheta && t <= k; t++) { /* g_B = E G_0 E + sum_t E_t G_t E + its transpose */
        roln_mm(w, w, w, m.E + t * ww, G + t * ww, tmp);
        roln_mm(w, w, w, tmp, m.E, S);
        rolni_twice_sym(w, S, tmp);
        for (j = 0; j < ww; j++)
            gtheta[ROLN_TRI(w) + j] += t == 0 ? tmp[j] / 2 : tmp[j];
    }
    rolni_spectral_bwd(ROLN_EXP, w, k, 0, &m.b, gE, rest);
    memset(S, 0, (size_t)ww * sizeof *S); /* gE is the cotangent of 1/2 W o L */
    rolni_sym(w, theta, tmp);
    for (t = 0; t <= k; t++)
        for (j = 0; j < ww; j++) {
            S[j] += gE[t * ww + j] * m.L[t * ww + j] / 2;
            G[t * ww + j] = gE[t * ww + j] * tmp[j] / 2;
        }
    rolni_tri_bwd(w, 1, 2, S, tmp);
    for (j = 0; gtheta && j < ROLN_TRI(w); j++)
        gtheta[j] += tmp[j];
    rolni_spectral_bwd(ROLN_LOG, w, k, 0, &m.a, G, rest);
}

/* The SPD matrices of row r and of the k directions p .. p+k-1 of its tape, [1+k][.][.] each: X_0 from the head, X_i+1
   from layer i, lie one after the other in chain (ROLNI_CHAIN), between them what the layers keep. F [k][m][m]: directions
   of U in the eigenbasis (rolni_directions); Cholesky: of L. *M gets the last. */
ROLN_FN roln_status rolni_form(const roln_lnn *f, int T, int k, const roln_real *theta, const rolni_tape *t, int r,
                               const roln_real *F, roln_real **M, roln_real *chain, roln_real *work)
{
    const int m = f->width[0], mm = m * m, step = ROLNI_LAYER_MEM(m, T);
    const roln_real *Q = t->Q + r * mm, *K = t->K + r * mm;
    roln_real *X = chain;
    int i, j;
    if (f->head == ROLN_CHOLESKY) {
        roln_mm_bt(m, m, m, Q, Q, X);
        for (i = 0; i < m; i++)
            X[i * (m + 1)] += f->least;
        for (j = 0; j < k; j++) {
            roln_mm_bt(m, m, m, F + j * mm, Q, work);
            rolni_twice_sym(m, work, X + (1 + j) * mm);
        }
    } else {
        for (i = 0; i < m; i++)
            work[i] = K[i * (m + 1)];
        roln_spd_form(m, work, Q, X, work + m);
        for (j = 0; j < k; j++) {
            for (i = 0; i < mm; i++)
                work[i] = K[i] * F[j * mm + i];
            rolni_congr_t_set(m, Q, work, X + (1 + j) * mm, work + mm);
        }
    }
    for (i = 0; i < f->layers; i++) {
        roln_real *mem = X + (1 + T) * mm, *next = mem + step;
        const roln_status st = rolni_layer(f, i, T, k, theta + rolni_layer_at(f, i), X, next, mem, work);
        if (st != ROLN_OK) return st;
        X = next;
    }
    *M = X;
    return ROLN_OK;
}

/* F_j = R U_j R^T for the k directions p .. p+k-1 of row r; Cholesky: F_j = L_j. work [2 m m]. */
ROLN_FN void rolni_directions(const roln_lnn *f, int nb, const rolni_tape *t, int r, int p, int k, roln_real *F, roln_real *work)
{
    const int m = f->width[0], mm = m * m;
    int j;
    for (j = 0; j < k; j++) {
        const roln_real *u = t->u + ((p + j) * nb + r) * ROLN_TRI(m);
        if (f->head == ROLN_CHOLESKY) {
            rolni_low(m, u, F + j * mm);
            continue;
        }
        rolni_sym(m, u, work);
        roln_congr(m, t->R + r * mm, work, F + j * mm, work + mm);
    }
}

/* One bilinear form c p^T M_t q of a block, p and q [nb][n], and where its cotangents go: gp += c M_t q, gq += c M_t p
   (each may be NULL). */
typedef struct {
    roln_real c;
    const roln_real *p, *q;
    roln_real *gp, *gq;
} rolni_pair;

/* Row r of the backward of sum_t c_t p_t^T M_t q_t, t = 0 the mass matrix, t = 1 .. k its derivatives along the directions
   p .. p+k-1: writes the cotangents gu of their planes (and plane 0) of u, adds to gp, gq and, for P and the layers, gtheta.
   P: exp_{BPB^T}(B U B^T) = B exp_P(U) B^T makes g_P = sym((sum_t gX_t X_t - gU_t U_t) P^-1); in the eigenbasis
   R^T sym(sum_t Z_t E_t - D_t S_t) R with X_t = Q^T E_t Q, U_t = Q^T S_t Q. [ours] */
ROLN_FN roln_status rolni_head_bwd(const roln_lnn *f, int T, int nb, int k, int p, const roln_real *theta, const rolni_tape *t,
                                   int r, const rolni_pair *pair, roln_real *gu, roln_real *gtheta, roln_real *work)
{
    const int n = f->n, m = f->width[0], mm = m * m, nn = n * n, tri = ROLN_TRI(m), formed = rolni_formed(f);
    const roln_real *Q = t->Q + r * mm, *R = t->R + r * mm, *K = t->K + r * mm, *l = t->l + r * m;
    roln_real *F = work, *Z = F + T * mm, *chain = Z + (1 + T) * mm;
    roln_real *tmp = chain + (formed ? ROLNI_CHAIN(m, f->layers, T) : 0), *S = tmp + mm, *B = S + mm;
    roln_real *x = B + mm + mm, *y = x + m, *v = y + m, *T3 = v + m, *M = NULL;
    roln_status st;
    int a, i, j;

    rolni_directions(f, nb, t, r, p, k, F, tmp);
    if (formed && (st = rolni_form(f, T, k, theta, t, r, F, &M, chain, tmp)) != ROLN_OK) return st;
    for (a = 0; a <= k; a++) {
        const roln_real *pr = pair[a].p + r * n, *qr = pair[a].q + r * n;
        roln_real *out[2];
        out[0] = pair[a].gp, out[1] = pair[a].gq;
        if (!formed) {
            roln_mm_bt(1, n, n, pr, Q, x);
            roln_mm_bt(1, n, n, qr, Q, y);
        }
        rolni_outer(n, pair[a].c, formed ? pr : x, formed ? qr : y, Z + a * nn);
        for (j = 0; j < 2; j++) {
            const roln_real *of = formed ? (j ? pr : qr) : (j ? x : y);
            if (!out[j]) continue;
            if (formed) roln_mm_bt(1, n, n, of, M + a * nn, v);
            else if (a > 0) rolni_apply(n, Q, K, F + (a - 1) * mm, of, v, tmp);
            else {
                for (i = 0; i < n; i++)
                    tmp[i] = K[i * (n + 1)] * of[i];
                roln_mm(1, n, n, tmp, Q, v);
            }
            for (i = 0; i < n; i++)
                out[j][r * n + i] += pair[a].c * v[i];
        }
    }
    for (i = f->layers - 1; i >= 0; i--) {
        const int at = rolni_layer_at(f, i), step = ROLNI_LAYER_MEM(m, T);
        roln_real *X = chain + i * (step + (1 + T) * mm);
        rolni_layer_bwd(f, i, T, k, theta + at, X, Z, gtheta ? gtheta + at : NULL, X + (1 + T) * mm, tmp);
    }
    if (f->head == ROLN_CHOLESKY) { /* g_L = 2 (G_0 L + sum_t G_t L_t), g_L_t = 2 G_t L */
        for (a = 0; a <= k; a++) {
            roln_mm(n, n, n, Z + a * nn, Q, S);
            for (j = 0; a == 0 && j < k; j++) {
                roln_mm(n, n, n, Z + (1 + j) * nn, F + j * nn, tmp);
                for (i = 0; i < nn; i++)
                    S[i] += tmp[i];
            }
            rolni_tri_bwd(n, 2, 2, S, gu + ((a ? p + a - 1 : 0) * nb + r) * tri);
        }
        return ROLN_OK;
    }
    for (a = 0; formed && a <= k; a++)
        roln_congr(m, Q, Z + a * mm, Z + a * mm, tmp);
    if (k > 0) roln_exp_dd2(m, l, K, T3);
    for (a = 0; f->base && a <= k; a++) { /* B = sum Z_t E_t */
        for (i = 0; i < m; i++)
            for (j = 0; j < m; j++)
                S[i * m + j] = a ? K[i * m + j] * F[(a - 1) * mm + i * m + j] : i == j ? K[i * m + j] : 0;
        if (a == 0) memset(B, 0, (size_t)mm * sizeof *B);
        roln_mm(m, m, m, Z + a * mm, S, tmp);
        for (i = 0; i < mm; i++)
            B[i] += tmp[i];
    }
    rolni_spectral_eig_bwd(m, k, K, T3, F, Z);
    for (a = 0; a <= k; a++) {
        rolni_congr_t_set(m, R, Z + a * mm, S, tmp);
        rolni_tri_bwd(m, 1, 2, S, gu + ((a ? p + a - 1 : 0) * nb + r) * tri);
        if (!f->base || !gtheta) continue;
        for (i = 0; i < m; i++)
            for (j = 0; j < m; j++)
                S[i * m + j] = a ? F[(a - 1) * mm + i * m + j] : i == j ? l[i] : 0;
        roln_mm(m, m, m, Z + a * mm, S, tmp);
        for (i = 0; i < mm; i++)
            B[i] -= tmp[i];
    }
    if (f->base && gtheta) {
        rolni_congr_t_set(m, R, B, S, tmp);
        rolni_twice_sym(m, S, B);
        for (i = 0; i < mm; i++)
            gtheta[rolni_base_at(f) + i] += B[i] / 2;
    }
    return ROLN_OK;
}

/* y_r = M x_r, from row r of a tape. work [m]. */
ROLN_FN void rolni_mul(const roln_lnn *f, const rolni_tape *t, int r, const roln_real *x, roln_real *y, roln_real *work)
{
    const int n = f->n;
    int i;
    if (rolni_formed(f)) {
        roln_mm_bt(1, n, n, x, t->M + r * n * n, y);
        return;
    }
    roln_mm_bt(1, n, n, x, t->Q + r * n * n, work);
    for (i = 0; i < n; i++)
        work[i] *= t->K[r * n * n + i * (n + 1)];
    roln_mm(1, n, n, work, t->Q + r * n * n, y);
}

/* y_r = M^-1 x_r: R^T (e^-l o (R x)), or by the Cholesky factor of a formed M. work [m]. */
ROLN_FN void rolni_minv(const roln_lnn *f, const rolni_tape *t, int r, const roln_real *x, roln_real *y, roln_real *work)
{
    const int n = f->n;
    if (rolni_formed(f)) {
        roln_solve_lower(n, t->C + r * n * n, x, work);
        roln_solve_lower_t(n, t->C + r * n * n, work, y);
        return;
    }
    roln_spd_mul(n, t->el + r * n, t->R + r * n * n, x, y, work);
}

/* y = DM[x_p] x for a block, x_p the direction p of the tape, whose plane of u is there. */
ROLN_FN roln_status rolni_dm(const roln_lnn *f, int T, int nb, int p, const roln_real *theta, const rolni_tape *t,
                             const roln_real *x, roln_real *y, roln_real *work)
{
    const int n = f->n, m = f->width[0], mm = m * m, formed = rolni_formed(f);
    roln_real *F = work, *chain = F + mm, *tmp = chain + (formed ? ROLNI_CHAIN(m, f->layers, T) : 0), *M = NULL;
    int r;
    for (r = 0; r < nb; r++) {
        rolni_directions(f, nb, t, r, p, 1, F, tmp);
        if (formed) {
            const roln_status st = rolni_form(f, T, 1, theta, t, r, F, &M, chain, tmp);
            if (st != ROLN_OK) return st;
            roln_mm_bt(1, n, n, x + r * n, M + n * n, y + r * n);
        } else {
            roln_mm_bt(1, n, n, x + r * n, t->Q + r * mm, tmp);
            rolni_apply(n, t->Q + r * mm, t->K + r * mm, F, tmp, y + r * n, tmp + n);
        }
    }
    return ROLN_OK;
}

/* ---- 4 mechanics ------------------------------------------------------------------------------ */

/* How much of the tape is wanted at s = [z; zd]: networks, mass matrix, d; also kin, g; also DM[zd] w. */
enum { ROLNI_MASS, ROLNI_GRADIENT, ROLNI_CORIOLIS };

/* Fill it. w [nb][n]: NULL for zd, or the direction T - 1 of the tape, whose plane of u is then filled, too. */
ROLN_FN roln_status rolni_eval(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_real *s, const roln_real *w,
                               int wanted, roln_real *tape, roln_real *work)
{
    const int n = f->n, m = f->width[0], mm = m * m, tri = ROLN_TRI(m), formed = rolni_formed(f);
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_real *pot = theta + roln_mlp_params(&f->mass), *P = theta + rolni_base_at(f), *damper = theta + rolni_damper_at(f);
    roln_real *gu = work, *S = gu + nb * tri, *G = S + mm, *tmp = G + mm, *M = NULL;
    roln_real *zd = t.x + T * nb * n;
    roln_status st;
    rolni_pair pair;
    const int dirs = wanted < ROLNI_CORIOLIS ? 0 : w ? 2 : 1, together = dirs == T; /* directions: the last ones */
    int r, i, j;

    if (!roln_all_finite(2 * nb * n, s)) return ROLN_E_NOT_FINITE;
    memcpy(t.x, s, (size_t)(nb * n) * sizeof *s);
    memcpy(zd, s + nb * n, (size_t)(nb * n) * sizeof *s);
    pair.c = ROLN_C(0.5), pair.p = zd, pair.q = w ? w : zd, pair.gp = pair.gq = NULL;
    roln_mlp_forward(&f->mass, T, 0, together ? 1 + T : 1, nb, theta, t.x, t.u, t.mass);
    if (dirs > 0 && !together) roln_mlp_forward(&f->mass, T, T - dirs + 1, dirs, nb, theta, t.x, t.u, t.mass);
    roln_mlp_forward(&f->potential, T > 1, 0, 1, nb, pot, t.x, t.v, t.pot);
    if (f->damping) roln_mlp_forward(&f->damper, 0, 0, 1, nb, damper, t.x, t.L, t.damp);
    if (f->base && (st = roln_chol(m, P, t.A)) != ROLN_OK) return st;

    for (r = 0; r < nb; r++) {
        roln_real *Q = t.Q + r * mm, *l = t.l + r * m;
        if (f->head == ROLN_CHOLESKY) {
            rolni_low(m, t.u + r * tri, Q);
        } else {
            rolni_sym(m, t.u + r * tri, S);
            if (f->base) { /* S = A^-1 U A^-T, A A^T = P */
                for (i = 0; i < m; i++)
                    roln_solve_lower(m, t.A, S + i * m, G + i * m);
                for (i = 0; i < m; i++) {
                    for (j = 0; j < m; j++)
                        tmp[j] = G[j * m + i];
                    roln_solve_lower(m, t.A, tmp, S + i * m);
                }
            }
            if ((st = roln_eig(m, S, l, Q, tmp)) != ROLN_OK || (st = roln_exp_range(m, l)) != ROLN_OK) return st;
            if (f->base) { /* Q = V A^T, R = V A^-1 */
                memcpy(S, Q, (size_t)mm * sizeof *S);
                roln_mm_bt(m, m, m, S, t.A, Q);
                for (i = 0; i < m; i++)
                    roln_solve_lower_t(m, t.A, S + i * m, t.R + r * mm + i * m);
            }
            roln_exp_dd1(m, l, t.K + r * mm);
            for (i = 0; i < m; i++)
                t.el[r * m + i] = roln_exp(-l[i]);
        }
        if (formed) {
            if ((st = rolni_form(f, T, 0, theta, &t, r, NULL, &M, S, S + ROLNI_CHAIN(m, f->layers, T))) != ROLN_OK) return st;
            for (i = 0; i < n; i++) /* symmetric to the bit */
                for (j = 0; j <= i; j++)
                    t.M[(r * n + i) * n + j] = t.M[(r * n + j) * n + i] = M[i * n + j];
            if ((st = roln_chol(n, t.M + r * n * n, t.C + r * n * n)) != ROLN_OK) return st;
        }
        if (wanted >= ROLNI_GRADIENT && (st = rolni_head_bwd(f, T, nb, 0, 0, theta, &t, r, &pair, gu, NULL, S)) != ROLN_OK)
            return st;
        for (i = 0; i < n; i++)
            t.d[r * n + i] = 0;
        if (f->damping) { /* d = L (L^T zd) */
            rolni_low(n, t.L + r * ROLN_TRI(n), S);
            roln_mm(1, n, n, zd + r * n, S, G);
            roln_mm_bt(1, n, n, G, S, t.d + r * n);
        }
    }
    if (wanted < ROLNI_GRADIENT) return ROLN_OK;
    if (dirs > 0 && (st = rolni_dm(f, T, nb, T, theta, &t, pair.q, t.dmv, S)) != ROLN_OK) return st;
    memset(t.kin, 0, (size_t)(2 * nb * n) * sizeof *t.kin); /* kin and g */
    roln_mlp_bwd(&f->mass, T, 1, nb, theta, t.x, t.mass, gu, t.kin, NULL, S);
    for (r = 0; r < nb; r++)
        gu[r] = 1;
    roln_mlp_bwd(&f->potential, T > 1, 1, nb, pot, t.x, t.pot, gu, t.g, NULL, S);
    return ROLN_OK;
}

/* Forward dynamics zdd = M^-1 (tau_z - c - g - d). theta, s [2][nb][n], tau_z [nb][n] (NULL: 0) in; zdd [nb][n] and the
   tape out. tape [ROLN_LNN_TAPE], T = 2 if roln_lnn_zdd_bwd is to follow, else 1; work [ROLN_LNN_WORK].
   Status of roln_eig, roln_exp_range and roln_chol (P, a formed M); zdd is written only on ROLN_OK. */
ROLN_FN roln_status roln_lnn_zdd(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_real *s,
                                 const roln_real *tau_z, roln_real *zdd, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_status st = rolni_eval(f, T, nb, theta, s, NULL, ROLNI_CORIOLIS, tape, work);
    int r, i;
    if (st != ROLN_OK) return st;
    for (r = 0; r < nb; r++) {
        roln_real *rhs = work, *y = work + n;
        for (i = r * n; i < r * n + n; i++)
            rhs[i - r * n] = (tau_z ? tau_z[i] : 0) - (t.dmv[i] - t.kin[i]) - t.g[i] - t.d[i];
        rolni_minv(f, &t, r, rhs, t.zdd + r * n, y);
    }
    if (!roln_all_finite(nb * n, t.zdd)) return ROLN_E_NOT_FINITE;
    memcpy(zdd, t.zdd, (size_t)(nb * n) * sizeof *zdd);
    return ROLN_OK;
}

/* Inverse dynamics tau_z = M zdd + C(z, zd) w + g + d, w [nb][n] a velocity of its own (NULL: zd):
       C(z, zd) w = 1/2 (DM[zd] w + DM[w] zd - grad_z (zd^T M w)),   Christoffel symbols, so that DM[zd] - 2C is skew.
   s [2][nb][n], zdd [nb][n] in; tau_z [nb][n] (may be w or zdd) and the tape out. T = 1 (2 with w), one more if
   roln_lnn_inverse_bwd is to follow. tape [ROLN_LNN_TAPE], work [ROLN_LNN_WORK + nb n]. Status of roln_lnn_zdd. */
ROLN_FN roln_status roln_lnn_inverse(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_real *s,
                                     const roln_real *w, const roln_real *zdd, roln_real *tau_z, roln_real *tape, roln_real *work)
{
    const int n = f->n, m = nb * n;
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    roln_real *out = work, *mem = out + m, *dir = t.x + (T - 1) * m;
    roln_status st;
    int r, i;
    if (w) memcpy(dir, w, (size_t)m * sizeof *w);
    memcpy(t.zdd, zdd, (size_t)m * sizeof *zdd);
    if ((st = rolni_eval(f, T, nb, theta, s, w ? dir : NULL, ROLNI_CORIOLIS, tape, mem)) != ROLN_OK) return st;
    if (w && (st = rolni_dm(f, T, nb, T - 1, theta, &t, t.x + T * m, out, mem)) != ROLN_OK) return st;
    for (i = 0; i < m; i++)
        out[i] = (w ? (t.dmv[i] + out[i]) / 2 : t.dmv[i]) - t.kin[i] + t.g[i] + t.d[i];
    for (r = 0; r < nb; r++) {
        rolni_mul(f, &t, r, t.zdd + r * n, mem, mem + n);
        for (i = 0; i < n; i++)
            out[r * n + i] += mem[i];
    }
    if (!roln_all_finite(m, out)) return ROLN_E_NOT_FINITE;
    memcpy(tau_z, out, (size_t)m * sizeof *out);
    return ROLN_OK;
}

/* The terms of the equations of motion at one state s = [z; zd]: M [n][n], c = C zd, g, d = R zd [n], kinetic and potential
   energy T, V; each output may be NULL. tape [ROLN_LNN_TAPE], work [ROLN_LNN_WORK], T = nb = 1. With E = T + V the power
   balance is dE/dt = zd^T (tau_z - d). */
ROLN_FN roln_status roln_lnn_terms(const roln_lnn *f, const roln_real *theta, const roln_real *s, roln_real *M, roln_real *c,
                                   roln_real *g, roln_real *d, roln_real *T, roln_real *V, roln_real *tape, roln_real *work)
{
    const int n = f->n, nn = n * n;
    const rolni_tape t = rolni_tape_of(f, 1, 1, tape);
    const int wanted = c ? ROLNI_CORIOLIS : g ? ROLNI_GRADIENT : ROLNI_MASS;
    const roln_status st = rolni_eval(f, 1, 1, theta, s, NULL, wanted, tape, work);
    roln_real *X = work, *p = X + nn, *e = p + n, twice;
    int i;
    if (st != ROLN_OK) return st;
    rolni_mul(f, &t, 0, s + n, p, e);
    twice = roln_dot(n, s + n, p);
    if (rolni_formed(f)) memcpy(X, t.M, (size_t)nn * sizeof *X);
    else {
        for (i = 0; i < n; i++)
            e[i] = t.K[i * (n + 1)];
        roln_spd_form(n, e, t.Q, X, e + n);
    }
    if (!roln_all_finite(nn, X) || !roln_finite(twice) || !roln_finite(t.v[0]) ||
        (wanted >= ROLNI_GRADIENT && !roln_all_finite(2 * n, t.kin)) || !roln_all_finite(n, t.d) || (c && !roln_all_finite(n, t.dmv)))
        return ROLN_E_NOT_FINITE;
    if (M) memcpy(M, X, (size_t)nn * sizeof *M);
    for (i = 0; i < n; i++) {
        if (c) c[i] = t.dmv[i] - t.kin[i];
        if (g) g[i] = t.g[i];
        if (d) d[i] = t.d[i];
    }
    if (T) *T = twice / 2;
    if (V) *V = t.v[0];
    return ROLN_OK;
}

/* Energies of a block: kinetic T_r = 1/2 zd^T M zd and potential V_r, [nb] each. s [2][nb][n] in; T, V and the tape out.
   dirs (the T of the other functions) = 1, or 2 if roln_lnn_energy_bwd is to follow, in losses of your own. tape
   [ROLN_LNN_TAPE], work [ROLN_LNN_WORK]. Status of roln_lnn_zdd. */
ROLN_FN roln_status roln_lnn_energy(const roln_lnn *f, int dirs, int nb, const roln_real *theta, const roln_real *s, roln_real *T,
                                    roln_real *V, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, dirs, nb, tape);
    const roln_status st = rolni_eval(f, dirs, nb, theta, s, NULL, ROLNI_MASS, tape, work);
    roln_real *p = work, *e = p + n, *mem = e + nb;
    int r;
    if (st != ROLN_OK) return st;
    for (r = 0; r < nb; r++) {
        rolni_mul(f, &t, r, s + (nb + r) * n, p, mem);
        e[r] = roln_dot(n, s + (nb + r) * n, p) / 2;
    }
    if (!roln_all_finite(nb, e) || !roln_all_finite(nb, t.v)) return ROLN_E_NOT_FINITE;
    memcpy(T, e, (size_t)nb * sizeof *T);
    memcpy(V, t.v, (size_t)nb * sizeof *V);
    return ROLN_OK;
}

/* ---- 5 backward ------------------------------------------------------------------------------- */

/* Gradient of a scalar that all backward passes share, on a tape filled at (z, zd):

       S = sum_t c_t p_t^T (D^t M) q_t - a^T g - a^T d      t = 0: M; t = 1 .. k: DM along direction t of the tape

   Directions: a is direction 1, zd is direction T; 1 .. k are used, k <= T, and those in between must be on the tape
   (x planes; their planes of u are filled here but for zd). One reverse sweep through the networks gives the cotangents:
   dir[t] += that of direction t (NULL: not wanted), dir[0] that of z, dir[T] that of zd, beside the shares in gp and gq.
   work [ROLN_LNN_WORK]. [ours] */
ROLN_FN void rolni_adjoint(const roln_lnn *f, int T, int nb, const roln_real *theta, roln_real *tape, int k, const roln_real *a,
                           const rolni_pair *pair, roln_real *const *dir, roln_real *gtheta, roln_real *work)
{
    const int n = f->n, m = nb * n, tri = nb * ROLN_TRI(f->width[0]), np = roln_mlp_params(&f->mass), da = rolni_damper_at(f);
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_real *zd = t.x + T * m;
    roln_real *gu = work, *gx = gu + (1 + T) * tri, *gv = gx + (1 + T) * m, *gL = gv + 2 * nb, *S = gL + nb * ROLN_TRI(n);
    int r, i, p;

    if (a) memcpy(t.x + m, a, (size_t)m * sizeof *a);
    for (p = 1; p <= k && p < T; p++)
        roln_mlp_forward(&f->mass, T, p, 1, nb, theta, t.x, t.u, t.mass);
    memset(gx, 0, (size_t)((1 + T) * m) * sizeof *gx);
    for (r = 0; r < nb; r++)
        rolni_head_bwd(f, T, nb, k, 1, theta, &t, r, pair, gu, gtheta, S);
    roln_mlp_bwd(&f->mass, T, 1 + k, nb, theta, t.x, t.mass, gu, gx, gtheta, S);

    if (a) { /* -a^T g = -DV[a] */
        roln_mlp_forward(&f->potential, 1, 1, 1, nb, theta + np, t.x, t.v, t.pot);
        for (i = 0; i < 2 * nb; i++)
            gv[i] = i < nb ? 0 : -1;
        roln_mlp_bwd(&f->potential, 1, 2, nb, theta + np, t.x, t.pot, gv, gx, gtheta ? gtheta + np : NULL, S);
    }
    if (a && f->damping) { /* -a^T d = -(L^T a)^T (L^T zd) */
        for (r = 0; r < nb; r++) {
            const roln_real *ar = t.x + m + r * n, *vr = zd + r * n;
            roln_real *L = S, *G = L + n * n, *x = G + n * n, *y = x + n;
            rolni_low(n, t.L + r * ROLN_TRI(n), L);
            roln_mm(1, n, n, ar, L, x);
            roln_mm(1, n, n, vr, L, y);
            for (i = 0; i < n * n; i++)
                G[i] = ar[i / n] * y[i % n] + vr[i / n] * x[i % n];
            rolni_tri_bwd(n, -1, -1, G, gL + r * ROLN_TRI(n));
            roln_mm_bt(1, n, n, x, L, y);
            for (i = 0; i < n; i++)
                gx[T * m + r * n + i] -= y[i];
        }
        roln_mlp_bwd(&f->damper, 0, 1, nb, theta + da, t.x, t.damp, gL, gx, gtheta ? gtheta + da : NULL, S);
    }
    for (p = 0; p <= T; p++)
        for (i = 0; dir[p] && i < m; i++)
            dir[p][i] += gx[p * m + i];
}

/* Backward of roln_lnn_zdd on its tape (T = 2) with cotangent y [nb][n] of zdd: lambda = M^-1 y is the cotangent of tau_z,
   and -lambda^T (M zdd + c + g + d) at fixed lambda, zdd gives the rest. Adds to gs [2][nb][n], gtau_z [nb][n] and gtheta
   (each may be NULL). work [ROLN_LNN_WORK + nb n]. */
ROLN_FN void roln_lnn_zdd_bwd(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, const roln_real *y,
                              roln_real *gs, roln_real *gtau_z, roln_real *gtheta, roln_real *work)
{
    const int n = f->n, m = nb * n;
    const rolni_tape t = rolni_tape_of(f, 2, nb, tape);
    const roln_real *zd = t.x + 2 * m;
    roln_real *lambda = work, *w = lambda + m, *gzd = gs ? gs + m : NULL;
    const rolni_pair pair[3] = {{-1, lambda, t.zdd, NULL, NULL}, {ROLN_C(0.5), zd, zd, gzd, gzd}, {-1, lambda, zd, NULL, gzd}};
    roln_real *const dir[3] = {gs, NULL, gzd};
    int r, i;
    for (r = 0; r < nb; r++)
        rolni_minv(f, &t, r, y + r * n, lambda + r * n, w);
    for (i = 0; gtau_z && i < m; i++)
        gtau_z[i] += lambda[i];
    rolni_adjoint(f, 2, nb, theta, tape, 2, lambda, pair, dir, gtheta, w);
}

/* Backward of roln_lnn_inverse on its tape (T = 2, with_w = 0; T = 3, with_w = 1) with cotangent y [nb][n] of tau_z. Adds to
   gs [2][nb][n], gw, gzdd [nb][n] and gtheta (each may be NULL). work [ROLN_LNN_WORK + nb n]. */
ROLN_FN void roln_lnn_inverse_bwd(const roln_lnn *f, int with_w, int nb, const roln_real *theta, roln_real *tape,
                                  const roln_real *y, roln_real *gs, roln_real *gw, roln_real *gzdd, roln_real *gtheta,
                                  roln_real *work)
{
    const int m = nb * f->n, T = 2 + with_w;
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_real *zd = t.x + T * m, *w = with_w ? t.x + 2 * m : zd;
    const roln_real half = with_w ? ROLN_C(0.5) : 1;
    roln_real *a = work, *mem = a + m, *gzd = gs ? gs + m : NULL;
    rolni_pair pair[4] = {{-1, NULL, NULL, NULL, NULL}, {ROLN_C(0.5), NULL, NULL, NULL, NULL}, {0, NULL, NULL, NULL, NULL},
                          {0, NULL, NULL, NULL, NULL}};
    roln_real *dir[4] = {NULL, NULL, NULL, NULL};
    int i;
    for (i = 0; i < m; i++) /* S = y^T tau_z */
        a[i] = -y[i];
    if (!with_w) gw = gzd;
    pair[0].p = a, pair[0].q = t.zdd, pair[0].gq = gzdd;
    pair[1].p = zd, pair[1].q = w, pair[1].gp = gzd, pair[1].gq = gw;       /* 1/2 zd^T DM[a] w */
    pair[T].c = -half, pair[T].p = a, pair[T].q = w, pair[T].gq = gw;       /* -1/2 a^T DM[zd] w */
    if (with_w) pair[2].c = -half, pair[2].p = a, pair[2].q = zd, pair[2].gq = gzd; /* -1/2 a^T DM[w] zd */
    dir[0] = gs, dir[T] = gzd;
    if (with_w) dir[2] = gw;
    rolni_adjoint(f, T, nb, theta, tape, T, a, pair, dir, gtheta, mem);
}

/* Backward of roln_lnn_energy on its tape (dirs = 2) with cotangents gT, gV [nb]. Adds to gs [2][nb][n] and gtheta (each may be
   NULL). work [ROLN_LNN_WORK + nb n]. */
ROLN_FN void roln_lnn_energy_bwd(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, const roln_real *gT,
                                 const roln_real *gV, roln_real *gs, roln_real *gtheta, roln_real *work)
{
    const int n = f->n, m = nb * n, np = roln_mlp_params(&f->mass);
    const rolni_tape t = rolni_tape_of(f, 2, nb, tape);
    const roln_real *zd = t.x + 2 * m;
    roln_real *p = work, *mem = p + m;
    const rolni_pair pair = {ROLN_C(0.5), p, zd, NULL, NULL};
    roln_real *const dir[3] = {gs, NULL, NULL};
    int r, i;
    for (i = 0; i < m; i++)
        p[i] = gT[i / n] * zd[i];
    rolni_adjoint(f, 2, nb, theta, tape, 0, NULL, &pair, dir, gtheta, mem);
    roln_mlp_bwd(&f->potential, 1, 1, nb, theta + np, t.x, t.pot, gV, gs, gtheta ? gtheta + np : NULL, mem);
    for (r = 0; gs && r < nb; r++) {
        rolni_mul(f, &t, r, p + r * n, mem, mem + n);
        for (i = 0; i < n; i++)
            gs[m + r * n + i] += mem[i];
    }
}

/* ---- 6 integrators ---------------------------------------------------------------------------- */

/* Explicit Euler (the paper's), the classical Runge-Kutta method of order 4, and the variational midpoint rule: the
   implicit midpoint rule in (z, p = M zd), which preserves dz ^ dp. */
enum { ROLN_EULER = 1, ROLN_RK4 = 2, ROLN_MIDPOINT = 3 };

#define ROLN_MIDPOINT_ITERS 10 /* fixed-point iterations of a midpoint step; the last may move zd by 1000 eps max(1, |zd|) */

/* A generalised force that depends on z, such as a held full-space torque reduced by J(z)^T. eval writes tau_z [nb][n];
   bwd adds to gz [nb][n] for the cotangent y [nb][n] of tau_z and, if params, to the gradient of the parameters in ctx. */
typedef struct {
    void (*eval)(void *ctx, int nb, const roln_real *z, roln_real *tau_z);
    void (*bwd)(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz);
    void *ctx;
} roln_force;

/* Tapes that a step fills when its backward is to follow (T = 2); without, it needs one (T = 1). */
#define ROLN_STAGES(scheme) ((scheme) == ROLN_EULER ? 1 : (scheme) == ROLN_RK4 ? 4 : 3)
#define ROLN_STEP_WORK(n, m, layers, formed, wide, T, nb) (8 * (nb) * (n) + ROLN_LNN_WORK(n, m, layers, formed, wide, T, nb))

/* sd = F(s) = [zd; zdd], the force taken at the z of s. */
ROLN_FN roln_status rolni_stage(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_force *force,
                                const roln_real *s, roln_real *sd, roln_real *tape, roln_real *work)
{
    const int m = nb * f->n;
    if (force) force->eval(force->ctx, nb, s, sd);
    {
        const roln_status st = roln_lnn_zdd(f, T, nb, theta, s, force ? sd : NULL, sd + m, tape, work);
        memcpy(sd, s + m, (size_t)m * sizeof *s);
        return st;
    }
}

/* Backward of rolni_stage at the state on its tape: gs += DF^T gsd. */
ROLN_FN void rolni_stage_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_force *force, roln_real *tape,
                             const roln_real *gsd, roln_real *gs, roln_real *gtheta, roln_real *work)
{
    const int m = nb * f->n;
    roln_real *lambda = work;
    int i;
    for (i = 0; i < m; i++)
        gs[m + i] += gsd[i], lambda[i] = 0;
    roln_lnn_zdd_bwd(f, nb, theta, tape, gsd + m, gs, lambda, gtheta, work + m);
    if (force) force->bwd(force->ctx, nb, rolni_tape_of(f, 2, nb, tape).x, lambda, 1, gs);
}

/* y = M x, y = M^-1 x for every row of a filled tape. work [m]. */
ROLN_FN void rolni_mul_all(const roln_lnn *f, int nb, const rolni_tape *t, const roln_real *x, roln_real *y, roln_real *work)
{
    int r;
    for (r = 0; r < nb; r++)
        rolni_mul(f, t, r, x + r * f->n, y + r * f->n, work);
}

ROLN_FN void rolni_minv_all(const roln_lnn *f, int nb, const rolni_tape *t, const roln_real *x, roln_real *y, roln_real *work)
{
    int r;
    for (r = 0; r < nb; r++)
        rolni_minv(f, t, r, x + r * f->n, y + r * f->n, work);
}

/* The variational midpoint rule (roln_lnn_step): with z_m = z + h/2 v, F = 1/2 grad_z(v^T M v) - g - d + tau_z at (z_m, v),
       M(z_m) v = p + h/2 F,   z+ = z + h v,   p+ = p + h F,   p = M(z) zd,   zd+ = M(z+)^-1 p+. */
ROLN_FN roln_status rolni_midpoint(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_force *force,
                                   roln_real h, const roln_real *s, roln_real *sn, roln_real *tape, int stride,
                                   roln_real *work)
{
    const int n = f->n, m = nb * n;
    roln_real *p = work, *F = p + m, *sm = F + m, *v = sm + m, *rhs = v + m, *w = rhs + m, *last = tape + 2 * stride;
    const rolni_tape t0 = rolni_tape_of(f, T, nb, tape), tm = rolni_tape_of(f, T, nb, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, T, nb, last);
    roln_status st;
    int it, i, settled = 1;
    if ((st = rolni_eval(f, T, nb, theta, s, NULL, ROLNI_MASS, tape, w)) != ROLN_OK) return st;
    rolni_mul_all(f, nb, &t0, s + m, p, w);
    memcpy(v, s + m, (size_t)m * sizeof *v);
    for (it = 0;; it++) {
        for (i = 0; i < m; i++)
            sm[i] = s[i] + h / 2 * v[i];
        if (force) force->eval(force->ctx, nb, sm, F);
        if ((st = rolni_eval(f, T, nb, theta, sm, NULL, ROLNI_GRADIENT, tape + stride, w)) != ROLN_OK) return st;
        for (i = 0; i < m; i++) {
            F[i] = tm.kin[i] - tm.g[i] - tm.d[i] + (force ? F[i] : 0);
            rhs[i] = p[i] + h / 2 * F[i];
        }
        if (it == ROLN_MIDPOINT_ITERS) break;
        rolni_minv_all(f, nb, &tm, rhs, w, w + m);
        for (settled = 1, i = 0; i < m; i++) { /* NaN does not settle */
            settled &= ROLN_ABS(w[i] - v[i]) <= 1000 * ROLN_EPS * ROLN_MAX(1, ROLN_ABS(w[i]));
            v[i] = w[i];
        }
    }
    if (!settled) return ROLN_E_NO_CONVERGENCE;
    for (i = 0; i < m; i++) {
        p[i] += h * F[i];
        sm[i] = s[i] + h * v[i];
    }
    if ((st = rolni_eval(f, T, nb, theta, sm, NULL, ROLNI_MASS, last, w)) != ROLN_OK) return st;
    rolni_minv_all(f, nb, &t1, p, t1.zdd, w);
    memcpy(sn, sm, (size_t)m * sizeof *sn);
    memcpy(sn + m, t1.zdd, (size_t)m * sizeof *sn);
    return ROLN_OK;
}

/* gz += d/dz of c p^T M x at the state on the tape, p and x held fixed; gtheta likewise. */
ROLN_FN void rolni_mass_bwd(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, roln_real c, const roln_real *p,
                            const roln_real *x, roln_real *gz, roln_real *gtheta, roln_real *work)
{
    const rolni_pair pair = {c, p, x, NULL, NULL};
    roln_real *const dir[3] = {gz, NULL, NULL};
    rolni_adjoint(f, 2, nb, theta, tape, 0, NULL, &pair, dir, gtheta, work);
}

/* Backward of c mu^T M v + a^T F, F = 1/2 grad_z(v^T M v) - g - d, at (z, v) on the tape; in the first term v is held fixed.
   Adds to gz, gv, gtheta. */
ROLN_FN void rolni_impulse_bwd(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, roln_real c,
                               const roln_real *mu, const roln_real *a, roln_real *gz, roln_real *gv, roln_real *gtheta,
                               roln_real *work)
{
    const roln_real *v = rolni_tape_of(f, 2, nb, tape).x + 2 * nb * f->n;
    const rolni_pair pair[2] = {{c, mu, v, NULL, NULL}, {ROLN_C(0.5), v, v, gv, gv}};
    roln_real *const dir[3] = {gz, NULL, gv};
    rolni_adjoint(f, 2, nb, theta, tape, 1, a, pair, dir, gtheta, work);
}

/* Backward of rolni_midpoint. The cotangent mu of the implicit equation solves, with a = h g_p+ + h/2 mu and
   S = a^T F - mu^T M v at z_m,   M mu = h g_z+ + dS/dv|_M + h/2 dS/dz_m,   by the same number of iterations. */
ROLN_FN void rolni_midpoint_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_force *force, roln_real h,
                                roln_real *tape, int stride, const roln_real *gsn, roln_real *gs, roln_real *gtheta,
                                roln_real *work)
{
    const int n = f->n, m = nb * n;
    const rolni_tape t0 = rolni_tape_of(f, 2, nb, tape), tm = rolni_tape_of(f, 2, nb, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, 2, nb, tape + 2 * stride);
    roln_real *gz = work, *gp = gz + m, *mu = gp + m, *a = mu + m, *gm = a + m, *gv = gm + m, *w = gv + m;
    int it, i;
    memset(work, 0, (size_t)(6 * m) * sizeof *work);
    rolni_minv_all(f, nb, &t1, gsn + m, gp, w);
    memcpy(gz, gsn, (size_t)m * sizeof *gz);
    rolni_mass_bwd(f, nb, theta, tape + 2 * stride, -1, gp, t1.zdd, gz, gtheta, w);
    for (it = 0;; it++) {
        const int final = it == ROLN_MIDPOINT_ITERS;
        memset(gm, 0, (size_t)(2 * m) * sizeof *gm);
        for (i = 0; i < m; i++)
            a[i] = h * gp[i] + h / 2 * mu[i];
        rolni_impulse_bwd(f, nb, theta, tape + stride, -1, mu, a, gm, gv, final ? gtheta : NULL, w);
        if (force) force->bwd(force->ctx, nb, tm.x, a, final, gm);
        if (final) break;
        for (i = 0; i < m; i++)
            gv[i] += h * gz[i] + h / 2 * gm[i];
        rolni_minv_all(f, nb, &tm, gv, mu, w);
    }
    for (i = 0; i < m; i++) { /* p = M(z) zd */
        gs[i] += gz[i] + gm[i];
        gp[i] += mu[i];
    }
    rolni_mass_bwd(f, nb, theta, tape, 1, gp, t0.x + 2 * m, gs, gtheta, w);
    rolni_mul_all(f, nb, &t0, gp, gv, w);
    for (i = 0; i < m; i++)
        gs[m + i] += gv[i];
}

/* One step of length h from s to sn, both [2][nb][n] (sn may be s); force may be NULL. tape: ROLN_STAGES(scheme)    tapes
   [ROLN_LNN_TAPE] of T = 2, or one of T = 1. work [ROLN_STEP_WORK]. sn is written only on ROLN_OK. ROLN_E_NO_CONVERGENCE: h too
   long for midpoint. */
ROLN_FN roln_status roln_lnn_step(const roln_lnn *f, int scheme, int T, int nb, const roln_real *theta,
                                  const roln_force *force, roln_real h, const roln_real *s, roln_real *sn, roln_real *tape,
                                  roln_real *work)
{
    static const roln_real weight[4] = {ROLN_C(1.0) / 6, ROLN_C(1.0) / 3, ROLN_C(1.0) / 3, ROLN_C(1.0) / 6};
    const int m2 = 2 * nb * f->n, stride = T > 1 ? roln_lnn_tape(f, T, nb) : 0;
    roln_real *next = work, *sx = next + m2, *k = sx + m2, *w = k + m2;
    const int stages = ROLN_STAGES(scheme);
    roln_status st;
    int j, i;
    if (scheme == ROLN_MIDPOINT) {
        if ((st = rolni_midpoint(f, T, nb, theta, force, h, s, next, tape, stride, sx)) != ROLN_OK) return st;
    } else {
        memcpy(next, s, (size_t)m2 * sizeof *s);
        memcpy(sx, s, (size_t)m2 * sizeof *s);
        for (j = 0; j < stages; j++) {
            const roln_real b = stages == 1 ? h : h * weight[j], c = j < 2 ? h / 2 : h;
            if ((st = rolni_stage(f, T, nb, theta, force, sx, k, tape + j * stride, w)) != ROLN_OK) return st;
            for (i = 0; i < m2; i++) {
                next[i] += b * k[i];
                sx[i] = s[i] + c * k[i];
            }
        }
    }
    if (!roln_all_finite(m2, next)) return ROLN_E_NOT_FINITE;
    memcpy(sn, next, (size_t)m2 * sizeof *sn);
    return ROLN_OK;
}

/* Backward of roln_lnn_step through its tapes: gsn [2][nb][n] in; adds to gs [2][nb][n], gtheta (may be NULL) and,
   through force->bwd, to what the force depends on. gs may not be gsn. work [ROLN_STEP_WORK], T = 2. */
ROLN_FN void roln_lnn_step_bwd(const roln_lnn *f, int scheme, int nb, const roln_real *theta, const roln_force *force,
                               roln_real h, roln_real *tape, const roln_real *gsn, roln_real *gs, roln_real *gtheta,
                               roln_real *work)
{
    static const roln_real weight[4] = {ROLN_C(1.0) / 6, ROLN_C(1.0) / 3, ROLN_C(1.0) / 3, ROLN_C(1.0) / 6};
    const int m2 = 2 * nb * f->n, stride = roln_lnn_tape(f, 2, nb);
    const int stages = ROLN_STAGES(scheme);
    roln_real *gx = work, *gk = gx + m2, *w = gk + m2;
    int j, i;
    if (scheme == ROLN_MIDPOINT) {
        rolni_midpoint_bwd(f, nb, theta, force, h, tape, stride, gsn, gs, gtheta, work);
        return;
    }
    memset(gx, 0, (size_t)m2 * sizeof *gx);
    for (i = 0; i < m2; i++)
        gs[i] += gsn[i];
    for (j = stages - 1; j >= 0; j--) { /* k_j enters s+ with weight b, the next stage with c */
        const roln_real b = stages == 1 ? h : h * weight[j], c = j < 2 ? h / 2 : h;
        for (i = 0; i < m2; i++) {
            gk[i] = b * gsn[i] + c * gx[i];
            gx[i] = 0;
        }
        rolni_stage_bwd(f, nb, theta, force, tape + j * stride, gk, gx, gtheta, w);
        for (i = 0; i < m2; i++)
            gs[i] += gx[i];
    }
}

/* The start of a motion known by positions only: s1 = [z1; zd1] from z0, z1 [nb][n] a step h apart, by the discrete Legendre
   transform of the variational midpoint rule,
       M(z1) zd1 = M(z_m) v + h/2 F(z_m, v),   z_m = (z0 + z1)/2,  v = (z1 - z0)/h.
   roln_lnn_step with ROLN_MIDPOINT goes on from there, so that three successive positions satisfy the discrete Euler-Lagrange
   equations. force may be NULL. Tapes: two of T = 2 if the backward is to follow, else one of T = 1. work [ROLN_STEP_WORK]. */
ROLN_FN roln_status roln_lnn_start(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_force *force, roln_real h,
                                   const roln_real *z0, const roln_real *z1, roln_real *s1, roln_real *tape, roln_real *work)
{
    const int m = nb * f->n, stride = T > 1 ? roln_lnn_tape(f, T, nb) : 0;
    const rolni_tape tm = rolni_tape_of(f, T, nb, tape), t1 = rolni_tape_of(f, T, nb, tape + stride);
    roln_real *sm = work, *p = sm + 2 * m, *F = p + m, *w = F + m;
    roln_status st;
    int i;
    for (i = 0; i < m; i++) {
        sm[i] = (z0[i] + z1[i]) / 2;
        sm[m + i] = (z1[i] - z0[i]) / h;
    }
    if (force) force->eval(force->ctx, nb, sm, F);
    if ((st = rolni_eval(f, T, nb, theta, sm, NULL, ROLNI_GRADIENT, tape, w)) != ROLN_OK) return st;
    rolni_mul_all(f, nb, &tm, sm + m, p, w);
    for (i = 0; i < m; i++) {
        p[i] += h / 2 * (tm.kin[i] - tm.g[i] - tm.d[i] + (force ? F[i] : 0));
        sm[i] = z1[i];
    }
    if ((st = rolni_eval(f, T, nb, theta, sm, NULL, ROLNI_MASS, tape + stride, w)) != ROLN_OK) return st;
    rolni_minv_all(f, nb, &t1, p, t1.zdd, w);
    if (!roln_all_finite(m, t1.zdd)) return ROLN_E_NOT_FINITE;
    memcpy(s1 + m, t1.zdd, (size_t)m * sizeof *s1);
    memcpy(s1, sm, (size_t)m * sizeof *s1);
    return ROLN_OK;
}

/* Backward of roln_lnn_start through its tapes: gs1 [2][nb][n] in; adds to gz0, gz1 [nb][n], gtheta (may be NULL) and, through
   force->bwd, to what the force depends on. */
ROLN_FN void roln_lnn_start_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_force *force, roln_real h,
                                roln_real *tape, const roln_real *gs1, roln_real *gz0, roln_real *gz1, roln_real *gtheta,
                                roln_real *work)
{
    const int m = nb * f->n, stride = roln_lnn_tape(f, 2, nb);
    const rolni_tape tm = rolni_tape_of(f, 2, nb, tape), t1 = rolni_tape_of(f, 2, nb, tape + stride);
    roln_real *gp = work, *a = gp + m, *gm = a + m, *gv = gm + m, *w = gv + m;
    int i;
    memset(gm, 0, (size_t)(2 * m) * sizeof *gm);
    rolni_minv_all(f, nb, &t1, gs1 + m, gp, w);
    rolni_mass_bwd(f, nb, theta, tape + stride, -1, gp, t1.zdd, gz1, gtheta, w);
    for (i = 0; i < m; i++)
        a[i] = h / 2 * gp[i];
    rolni_impulse_bwd(f, nb, theta, tape, 1, gp, a, gm, gv, gtheta, w);
    if (force) force->bwd(force->ctx, nb, tm.x, a, 1, gm);
    rolni_mul_all(f, nb, &tm, gp, w, w + m);
    for (i = 0; i < m; i++) {
        const roln_real v = (gv[i] + w[i]) / h, z = gm[i] / 2;
        gz0[i] += z - v;
        gz1[i] += gs1[i] + z + v;
    }
}

/* Linearisation of a step, nb = 1: sn = step(s), A = d sn / d s [2n][2n]. The backward runs once per row; before row i *row is
   set to B + i width, so that force->bwd may add there the derivative of sn_i by what the force depends on. B is zeroed;
   force and B may be NULL. tape: ROLN_STAGES(scheme) of T = 2, work [ROLN_STEP_WORK + 2 n]. sn, A, B are written only on
   ROLN_OK. Cost about 4n steps. */
ROLN_FN roln_status roln_lnn_linear(const roln_lnn *f, int scheme, const roln_real *theta, const roln_force *force, roln_real h,
                                    const roln_real *s, int width, roln_real **row, roln_real *sn, roln_real *A, roln_real *B,
                                    roln_real *tape, roln_real *work)
{
    const int n2 = 2 * f->n;
    roln_real *e = work, *w = e + n2;
    const roln_status st = roln_lnn_step(f, scheme, 2, 1, theta, force, h, s, sn, tape, w);
    int i, j;
    if (st != ROLN_OK) return st;
    memset(A, 0, (size_t)(n2 * n2) * sizeof *A);
    if (B) memset(B, 0, (size_t)(n2 * width) * sizeof *B);
    for (i = 0; i < n2; i++) {
        for (j = 0; j < n2; j++)
            e[j] = i == j;
        if (B) *row = B + i * width;
        roln_lnn_step_bwd(f, scheme, 1, theta, force, h, tape, e, A + i * n2, NULL, w);
    }
    return ROLN_OK;
}

#endif
