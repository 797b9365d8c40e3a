/* roln_lnn.h - Lagrangian neural network: a learned mass matrix and potential, and the motion they imply.

       M(z) zdd + C(z,zd) zd + g(z) = tau_z        M = exp_P(U(z)),  g = dV/dz

   u and V are multilayer perceptrons of z, U the symmetric matrix filled from u, exp_P the exponential map at the
   base point P, so M is positive definite whatever the weights. C comes from the Christoffel symbols of M:

       c = C zd = DM[zd] zd - 1/2 grad_z (zd^T M zd)

   one directional derivative and one gradient; neither dM/dz nor M^-1 is ever formed.
   After Friedl et al., ICLR 2025, Eqs. 4-8; [ours] in the form of c and of its backward.

   1 perceptron     2 shape and layout     3 evaluation     4 mechanics     5 backward     6 integrators

   Samples come in blocks of nb rows, state s = [z; zd] as [2][nb][n]. Forward functions fill a tape; backward functions
   read the tape, add to their outputs and skip those that are NULL. */

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

/* Plane t of a block: t = 0 the values y = f(x), t = 1 .. T the directional derivatives y_t = Df(x)[x_t], for which
   plane 0 must be on the tape. x [1+T][nb][in], theta in; y [1+T][nb][out] (plane t written),
   tape [ROLN_MLP_TAPE]: per hidden layer the slopes softplus'(a) and the outputs of all planes. */
#define ROLN_MLP_TAPE(T, nb, hidden) ((2 + (T)) * (nb) * (hidden))
ROLN_FN void roln_mlp_forward(const roln_mlp *f, int T, int t, int nb, const roln_real *theta, const roln_real *x,
                              roln_real *y, roln_real *tape)
{
    const roln_real *in = x + t * nb * f->size[0];
    int l, r, i;
    for (l = 0; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1], last = l + 1 == f->layers;
        const roln_real *b = theta + ni * no;
        roln_real *s = tape, *out = (last ? y : s + nb * no) + t * nb * no;
        if (last) roln_mm_bt(nb, ni, no, in, theta, out);
        else roln_mm(nb, ni, no, in, theta, out);
        for (r = 0; r < nb && t == 0; r++)
            for (i = 0; i < no; i++)
                out[r * no + i] += b[i];
        if (!last && t == 0) roln_softplus_n(nb * no, out, out, s);
        for (i = 0; i < nb * no && !last && t > 0; i++)
            out[i] *= s[i];
        theta = b + no;
        tape += (2 + T) * nb * no;
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

/* Number of entries of u: the lower triangle of U. */
#define ROLN_TRI(n) ((n) * ((n) + 1) / 2)

/* Shape of a Lagrangian network; mass and potential have the same hidden sizes. */
typedef struct {
    int n;              /* degrees of freedom */
    int base;           /* 0: base point I, 1: learned P */
    roln_mlp mass;      /* z -> u, ROLN_TRI(n) outputs */
    roln_mlp potential; /* z -> V, one output */
} roln_lnn;

/* theta holds the mass network, the potential network and, if base, P [n][n]. */
ROLN_FN int roln_lnn_params(const roln_lnn *f)
{
    return roln_mlp_params(&f->mass) + roln_mlp_params(&f->potential) + (f->base ? f->n * f->n : 0);
}

/* Random networks, P = I. The outputs start small, so that M is near P and no eigenvalue of U out of range. */
ROLN_FN void roln_lnn_init(const roln_lnn *f, roln_real *theta, uint64_t *seed)
{
    int i;
    roln_mlp_init(&f->mass, ROLN_C(0.1), theta, seed);
    theta += roln_mlp_params(&f->mass);
    roln_mlp_init(&f->potential, 1, theta, seed);
    theta += roln_mlp_params(&f->potential);
    for (i = 0; f->base && i < f->n * f->n; i++)
        theta[i] = i % (f->n + 1) == 0;
}

/* The tape of a block. T = 1 serves the forward pass, T = 2 also the backward (one more direction). Where things lie: */
typedef struct {
    roln_real *x;    /* [1+T][nb][n]   directions: z, (T = 2: lambda), zd */
    roln_real *u;    /* [1+T][nb][tri] mass network */
    roln_real *mass; /*                its tape */
    roln_real *v;    /* [T][nb]        potential */
    roln_real *pot;  /*                its tape */
    roln_real *kin;  /* [nb][n]        1/2 grad_z (zd^T M zd) */
    roln_real *g;    /* [nb][n]        dV/dz */
    roln_real *dmv;  /* [nb][n]        DM[zd] zd */
    roln_real *zdd;  /* [nb][n] */
    roln_real *l;    /* [nb][n]        eigenvalues of S = A^-1 U A^-T */
    roln_real *el;   /* [nb][n]        e^-l */
    roln_real *w;    /* [nb][n]        Q zd */
    roln_real *Q;    /* [nb][n][n]     M = Q^T e^l Q */
    roln_real *R;    /* [nb][n][n]     M^-1 = R^T e^-l R, Q R^T = I; R is Q where P = I */
    roln_real *K;    /* [nb][n][n]     exp[l_i, l_j] */
    roln_real *F;    /* [nb][n][n]     R sym(ud) R^T, the direction zd in the eigenbasis */
    roln_real *A;    /* [n][n]         lower Cholesky factor of P */
} rolni_tape;

#define ROLN_LNN_TAPE(n, hidden, T, nb) \
    ((nb) * ((1 + (T)) * ((n) + ROLN_TRI(n)) + (T) + 7 * (n) + 4 * (n) * (n)) + (n) * (n) + \
     ROLN_MLP_TAPE(T, nb, hidden) + ROLN_MLP_TAPE((T) - 1, nb, hidden))

/* Work for every function below. wide: the largest of n and the hidden sizes. */
#define ROLN_LNN_WORK(n, wide, T, nb) \
    ((T) > 1 ? (nb) * (3 * ROLN_TRI(n) + 3 * (n) + 2) + \
                   ROLN_MAX(6 * (n) * (n) + 4 * (n) + (n) * (n) * (n), ROLN_MLP_BWD_WORK(3, nb, wide)) \
             : (nb) * ROLN_TRI(n) + ROLN_MAX(3 * (n) * (n) + ROLN_EIG_WORK(n), ROLN_MLP_BWD_WORK(1, nb, wide)))

ROLN_FN rolni_tape rolni_tape_of(const roln_lnn *f, int T, int nb, roln_real *mem)
{
    const int n = f->n, h = roln_mlp_hidden(&f->mass), nn = nb * n * n;
    rolni_tape t;
    t.x = mem;
    t.u = t.x + (1 + T) * nb * n;
    t.mass = t.u + (1 + T) * nb * ROLN_TRI(n);
    t.v = t.mass + ROLN_MLP_TAPE(T, nb, h);
    t.pot = t.v + T * nb;
    t.kin = t.pot + ROLN_MLP_TAPE(T - 1, nb, h);
    t.g = t.kin + nb * n;
    t.dmv = t.g + nb * n;
    t.zdd = t.dmv + nb * n;
    t.l = t.zdd + nb * n;
    t.el = t.l + nb * n;
    t.w = t.el + nb * n;
    t.Q = t.w + nb * n;
    t.R = f->base ? t.Q + nn : t.Q;
    t.K = t.Q + 2 * nn;
    t.F = t.K + nn;
    t.A = t.F + nn;
    return t;
}

/* ---- 3 evaluation ----------------------------------------------------------------------------- */

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

/* gu = scale * the cotangent of u that belongs to the symmetric cotangent G of U. */
ROLN_FN void rolni_sym_bwd(int n, roln_real scale, const roln_real *G, roln_real *gu)
{
    int i, j;
    for (i = 0; i < n; i++)
        *gu++ = scale * G[i * n + i];
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            *gu++ = 2 * scale * G[i * n + j];
}

/* Y = B X B^T (all n x n), X symmetric. work [n][n]. */
ROLN_FN void rolni_congruence(int n, const roln_real *B, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_mm(n, n, n, B, X, work);
    roln_mm_bt(n, n, n, work, B, Y);
}

/* Y = B^T X B (all n x n). work [n][n]. */
ROLN_FN void rolni_congruence_t(int n, const roln_real *B, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_mm(n, n, n, X, B, work);
    memset(Y, 0, (size_t)(n * n) * sizeof *Y);
    roln_mm_at(n, n, n, B, work, Y);
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

/* y = R^T (e^-l o (R x)) = M^-1 x. work [n]. */
ROLN_FN void rolni_minv(int n, const roln_real *R, const roln_real *el, const roln_real *x, roln_real *y, roln_real *work)
{
    int i;
    roln_mm_bt(1, n, n, x, R, work);
    for (i = 0; i < n; i++)
        work[i] *= el[i];
    roln_mm(1, n, n, work, R, y);
}

/* Fill the tape at s = [z; zd]: networks, eigenbasis of U, kin, g; with `coriolis` also DM[zd] zd. */
ROLN_FN roln_status rolni_eval(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_real *s, int coriolis,
                               roln_real *tape, roln_real *work)
{
    const int n = f->n, tri = ROLN_TRI(n), nn = n * n;
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_real *pot = theta + roln_mlp_params(&f->mass), *P = pot + roln_mlp_params(&f->potential);
    roln_real *gu = work, *S = gu + nb * tri, *G = S + nn, *tmp = G + nn, *eig = tmp + nn;
    roln_real *zd = t.x + T * nb * n;
    roln_status st;
    int r, i, j;

    if (!roln_all_finite(2 * nb * n, s)) return ROLN_E_NOT_FINITE;
    memcpy(t.x, s, (size_t)(nb * n) * sizeof *s);
    memcpy(zd, s + nb * n, (size_t)(nb * n) * sizeof *s);
    roln_mlp_forward(&f->mass, T, 0, nb, theta, t.x, t.u, t.mass);
    roln_mlp_forward(&f->potential, T - 1, 0, nb, pot, t.x, t.v, t.pot);
    if (coriolis) roln_mlp_forward(&f->mass, T, T, nb, theta, t.x, t.u, t.mass);
    if (f->base && (st = roln_chol(n, P, t.A)) != ROLN_OK) return st;

    for (r = 0; r < nb; r++) {
        roln_real *Q = t.Q + r * nn, *R = t.R + r * nn, *K = t.K + r * nn, *l = t.l + r * n, *w = t.w + r * n;
        rolni_sym(n, t.u + r * tri, S);
        if (f->base) { /* S = A^-1 U A^-T, A A^T = P */
            for (i = 0; i < n; i++)
                roln_solve_lower(n, t.A, S + i * n, G + i * n);
            for (i = 0; i < n; i++) {
                for (j = 0; j < n; j++)
                    tmp[j] = G[j * n + i];
                roln_solve_lower(n, t.A, tmp, S + i * n);
            }
        }
        if ((st = roln_eig(n, S, l, Q, eig)) != ROLN_OK || (st = roln_exp_range(n, l)) != ROLN_OK) return st;
        if (f->base) { /* Q = V A^T, R = V A^-1 */
            memcpy(S, Q, (size_t)nn * sizeof *S);
            roln_mm_bt(n, n, n, S, t.A, Q);
            for (i = 0; i < n; i++)
                roln_solve_lower_t(n, t.A, S + i * n, R + i * n);
        }
        roln_exp_dd1(n, l, K);
        for (i = 0; i < n; i++)
            t.el[r * n + i] = roln_exp(-l[i]);
        roln_mm_bt(1, n, n, zd + r * n, Q, w);
        for (i = 0; i < n; i++) /* d(zd^T M zd)/dU = R^T (K o w w^T) R */
            for (j = 0; j < n; j++)
                G[i * n + j] = K[i * n + j] * (w[i] * w[j]);
        rolni_congruence_t(n, R, G, S, tmp);
        rolni_sym_bwd(n, ROLN_C(0.5), S, gu + r * tri);
        if (coriolis) {
            rolni_sym(n, t.u + (T * nb + r) * tri, S);
            rolni_congruence(n, R, S, t.F + r * nn, tmp);
            rolni_apply(n, Q, K, t.F + r * nn, w, t.dmv + r * n, tmp);
        }
    }
    memset(t.kin, 0, (size_t)(2 * nb * n) * sizeof *t.kin); /* kin and g */
    roln_mlp_bwd(&f->mass, T, 1, nb, theta, t.x, t.mass, gu, t.kin, NULL, S);
    for (r = 0; r < nb; r++)
        gu[r] = 1;
    roln_mlp_bwd(&f->potential, T - 1, 1, nb, pot, t.x, t.pot, gu, t.g, NULL, S);
    return ROLN_OK;
}

/* ---- 4 mechanics ------------------------------------------------------------------------------ */

/* zdd = M^-1 (tau_z - c - g). theta, s [2][nb][n], tau_z [nb][n] (NULL: 0) in; zdd [nb][n] and the tape out.
   tape [ROLN_LNN_TAPE(n, hidden, T, nb)], T = 2 if roln_lnn_zdd_bwd is to follow, else 1; work [ROLN_LNN_WORK].
   Status of roln_eig, roln_exp_range and roln_chol (P); zdd is written only on ROLN_OK. */
ROLN_FN roln_status roln_lnn_zdd(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_real *s,
                                 const roln_real *tau_z, roln_real *zdd, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, T, nb, tape);
    const roln_status st = rolni_eval(f, T, nb, theta, s, 1, tape, work);
    int r, i;
    if (st != ROLN_OK) return st;
    for (r = 0; r < nb; r++) {
        roln_real *rhs = work, *y = work + n;
        for (i = r * n; i < r * n + n; i++)
            rhs[i - r * n] = (tau_z ? tau_z[i] : 0) - (t.dmv[i] - t.kin[i]) - t.g[i];
        rolni_minv(n, t.R + r * n * n, t.el + r * n, rhs, t.zdd + r * n, y);
    }
    if (!roln_all_finite(nb * n, t.zdd)) return ROLN_E_NOT_FINITE;
    memcpy(zdd, t.zdd, (size_t)(nb * n) * sizeof *zdd);
    return ROLN_OK;
}

/* The terms of the equations of motion at one state s = [z; zd]: M [n][n], c = C zd [n], g [n], kinetic and potential
   energy T, V; each output may be NULL. tape [ROLN_LNN_TAPE(n, hidden, 1, 1)], work [ROLN_LNN_WORK(n, wide, 1, 1)]. */
ROLN_FN roln_status roln_lnn_terms(const roln_lnn *f, const roln_real *theta, const roln_real *s, roln_real *M, roln_real *c,
                                   roln_real *g, roln_real *T, roln_real *V, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, 1, 1, tape);
    const roln_status st = rolni_eval(f, 1, 1, theta, s, c != NULL, tape, work);
    roln_real *Qe = work, twice = 0;
    int i, j;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) {
        const roln_real e = t.K[i * n + i], root = ROLN_SQRT(e); /* M = (e^l/2 Q)^T (e^l/2 Q), symmetric to the bit */
        for (j = 0; j < n; j++)
            Qe[i * n + j] = root * t.Q[i * n + j];
        twice += e * (t.w[i] * t.w[i]);
    }
    if (!roln_all_finite(n, t.w) || !roln_finite(twice) || !roln_finite(t.v[0]) || !roln_all_finite(2 * n, t.kin) ||
        (c && !roln_all_finite(n, t.dmv)))
        return ROLN_E_NOT_FINITE;
    if (M) {
        memset(M, 0, (size_t)(n * n) * sizeof *M);
        roln_mm_at(n, n, n, Qe, Qe, M);
    }
    for (i = 0; i < n; i++) {
        if (c) c[i] = t.dmv[i] - t.kin[i];
        if (g) g[i] = t.g[i];
    }
    if (T) *T = twice / 2;
    if (V) *V = t.v[0];
    return ROLN_OK;
}

/* ---- 5 backward ------------------------------------------------------------------------------- */

/* X += scale * x m^T - gU U: the share of one direction in g_P (see rolni_adjoint); gU, u may be NULL. */
ROLN_FN void rolni_base_bwd(int n, const roln_real *gU, const roln_real *u, roln_real scale, const roln_real *x,
                            const roln_real *m, roln_real *X, roln_real *U, roln_real *work)
{
    int i, j;
    if (gU) {
        rolni_sym(n, u, U);
        roln_mm(n, n, n, gU, U, work);
        for (i = 0; i < n * n; i++)
            X[i] -= work[i];
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            X[i * n + j] += scale * x[i] * m[j];
}

/* Gradient of a scalar that all backward passes share, on a tape (T = 2) filled at (z, zd):

       S(z, zd) = - b^T M x - kappa a^T DM[zd] zd + 1/2 zd^T DM[a] zd - a^T g          a, b, x held fixed [nb][n]

   With S1 = A^-1 U A^-T and everything in its eigenbasis (p = Q a, q = Q b, y = Q x, w = Q zd; F1, F2 the directions zd
   and a): the cotangents are
       of u      - K o sym(q y^T) - kappa D2exp[F1, sym(p w^T)] + 1/2 D2exp[F2, w w^T]
       of u(zd)  - kappa K o sym(p w^T)         of u(a)  1/2 K o w w^T
   and one reverse sweep through the networks does the rest. Adds to gz, gzd [nb][n] and gtheta (each may be NULL).
   P: exp_{BPB^T}(B U B^T) = B exp_P(U) B^T gives g_P = sym((sum_k gM_k M_k - gU_k U_k) P^-1), k over value and
   directions. [ours] */
ROLN_FN void rolni_adjoint(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, roln_real kappa,
                           const roln_real *a, const roln_real *b, const roln_real *x, roln_real *gz, roln_real *gzd,
                           roln_real *gtheta, roln_real *work)
{
    const int n = f->n, tri = ROLN_TRI(n), nn = n * n, np = roln_mlp_params(&f->mass);
    const rolni_tape t = rolni_tape_of(f, 2, nb, tape);
    const roln_real *pot = theta + np, *zd = t.x + 2 * nb * n;
    roln_real *gu = work, *gx = gu + 3 * nb * tri, *gv = gx + 3 * nb * n, *S = gv + 2 * nb;
    roln_real *G = S + nn, *F2 = G + nn, *D = F2 + nn, *tmp = D + nn, *X = tmp + nn;
    roln_real *p = X + nn, *q = p + n, *y = q + n, *vec = y + n, *T3 = vec + n;
    int r, i, j, k;

    memcpy(t.x + nb * n, a, (size_t)(nb * n) * sizeof *a);
    roln_mlp_forward(&f->mass, 2, 1, nb, theta, t.x, t.u, t.mass);
    roln_mlp_forward(&f->potential, 1, 1, nb, pot, t.x, t.v, t.pot);
    memset(gx, 0, (size_t)(3 * nb * n) * sizeof *gx);
    memset(X, 0, (size_t)nn * sizeof *X);

    for (r = 0; r < nb; r++) {
        const roln_real *Q = t.Q + r * nn, *R = t.R + r * nn, *K = t.K + r * nn, *F1 = t.F + r * nn, *w = t.w + r * n;
        const roln_real *ar = a + r * n, *br = b + r * n, *xr = x + r * n, *vr = zd + r * n;
        roln_real *gzd_r = gx + (2 * nb + r) * n, *m2v = vec;

        roln_mm_bt(1, n, n, ar, Q, p);
        roln_mm_bt(1, n, n, br, Q, q);
        roln_mm_bt(1, n, n, xr, Q, y);
        rolni_sym(n, t.u + (nb + r) * tri, S);
        rolni_congruence(n, R, S, F2, tmp);
        roln_exp_dd2(n, t.l + r * n, K, T3);

        /* u(a): 1/2 K o w w^T, and its share of u */
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                S[i * n + j] = ROLN_C(0.5) * (w[i] * w[j]);
                D[i * n + j] = -ROLN_C(0.5) * K[i * n + j] * (q[i] * y[j] + y[i] * q[j]);
                G[i * n + j] = K[i * n + j] * S[i * n + j];
            }
        roln_exp_d2(n, T3, F2, S, D);
        rolni_congruence_t(n, R, G, S, tmp);
        rolni_sym_bwd(n, 1, S, gu + (nb + r) * tri);
        rolni_apply(n, Q, K, F2, w, m2v, tmp);
        for (i = 0; i < n; i++)
            gzd_r[i] += m2v[i];
        if (f->base) rolni_base_bwd(n, S, t.u + (nb + r) * tri, ROLN_C(0.5), vr, m2v, X, G, tmp);

        /* u(zd): -kappa K o sym(p w^T), and its share of u; without kappa the tape does not hold this direction */
        if (kappa != 0) {
            for (i = 0; i < n; i++)
                for (j = 0; j < n; j++) {
                    S[i * n + j] = -ROLN_C(0.5) * kappa * (p[i] * w[j] + w[i] * p[j]);
                    G[i * n + j] = K[i * n + j] * S[i * n + j];
                }
            roln_exp_d2(n, T3, F1, S, D);
            rolni_congruence_t(n, R, G, S, tmp);
            rolni_sym_bwd(n, 1, S, gu + (2 * nb + r) * tri);
            rolni_apply(n, Q, K, F1, p, vec, tmp);
            for (i = 0; i < n; i++)
                gzd_r[i] -= kappa * vec[i];
            if (f->base) {
                rolni_base_bwd(n, S, t.u + (2 * nb + r) * tri, -ROLN_C(0.5) * kappa, vr, vec, X, G, tmp);
                rolni_base_bwd(n, NULL, NULL, -ROLN_C(0.5) * kappa, ar, t.dmv + r * n, X, G, tmp);
            }
        }

        /* u */
        rolni_congruence_t(n, R, D, S, tmp);
        rolni_sym_bwd(n, 1, S, gu + r * tri);
        if (f->base) { /* M x, M b */
            for (i = 0; i < n; i++)
                q[i] *= K[i * n + i], y[i] *= K[i * n + i];
            roln_mm(1, n, n, y, Q, p);
            rolni_base_bwd(n, S, t.u + r * tri, -ROLN_C(0.5), br, p, X, G, tmp);
            roln_mm(1, n, n, q, Q, p);
            rolni_base_bwd(n, NULL, NULL, -ROLN_C(0.5), xr, p, X, G, tmp);
        }
    }

    if (f->base && gtheta) { /* g_P += sym(X P^-1) */
        roln_real *gP = gtheta + np + roln_mlp_params(&f->potential);
        for (i = 0; i < n; i++) {
            roln_solve_lower(n, t.A, X + i * n, X + i * n);
            roln_solve_lower_t(n, t.A, X + i * n, X + i * n);
        }
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                gP[i * n + j] += ROLN_C(0.5) * (X[i * n + j] + X[j * n + i]);
    }
    roln_mlp_bwd(&f->mass, 2, kappa != 0 ? 3 : 2, nb, theta, t.x, t.mass, gu, gx, gtheta, S);
    for (k = 0; k < 2 * nb; k++)
        gv[k] = k < nb ? 0 : -1; /* -a^T g = -DV[a] */
    roln_mlp_bwd(&f->potential, 1, 2, nb, pot, t.x, t.pot, gv, gx, gtheta ? gtheta + np : NULL, S);
    for (i = 0; gz && i < nb * n; i++)
        gz[i] += gx[i];
    for (i = 0; gzd && i < nb * n; i++)
        gzd[i] += gx[2 * nb * n + i];
}

/* Backward of roln_lnn_zdd on its tape (T = 2) with cotangent y [nb][n] of zdd: lambda = M^-1 y is the cotangent of
   tau_z, and S with a = b = lambda, x = zdd, kappa = 1 gives the rest. Adds to gs [2][nb][n], gtau_z [nb][n] and gtheta
   (each may be NULL). work [nb n + ROLN_LNN_WORK(n, wide, 2, nb)]. */
ROLN_FN void roln_lnn_zdd_bwd(const roln_lnn *f, int nb, const roln_real *theta, roln_real *tape, const roln_real *y,
                              roln_real *gs, roln_real *gtau_z, roln_real *gtheta, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, 2, nb, tape);
    roln_real *lambda = work, *w = lambda + nb * n;
    int r, i;
    for (r = 0; r < nb; r++)
        rolni_minv(n, t.R + r * n * n, t.el + r * n, y + r * n, lambda + r * n, w);
    for (i = 0; gtau_z && i < nb * n; i++)
        gtau_z[i] += lambda[i];
    rolni_adjoint(f, nb, theta, tape, 1, lambda, lambda, t.zdd, gs, gs ? gs + nb * n : NULL, gtheta, w);
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
#define ROLN_STEP_WORK(n, wide, T, nb) (8 * (nb) * (n) + ROLN_LNN_WORK(n, wide, T, nb))

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

/* y = M x = Q^T (e^l o (Q x)) for every sample of a filled tape. work [n]. */
ROLN_FN void rolni_mass_mul(int n, int nb, const rolni_tape *t, const roln_real *x, roln_real *y, roln_real *work)
{
    int r, i;
    for (r = 0; r < nb; r++) {
        roln_mm_bt(1, n, n, x + r * n, t->Q + r * n * n, work);
        for (i = 0; i < n; i++)
            work[i] *= t->K[r * n * n + i * (n + 1)];
        roln_mm(1, n, n, work, t->Q + r * n * n, y + r * n);
    }
}

/* The variational midpoint rule (roln_lnn_step): with z_m = z + h/2 v, F = 1/2 grad_z(v^T M v) - g + tau_z at z_m,
       M(z_m) v = p + h/2 F,   z+ = z + h v,   p+ = p + h F,   p = M(z) zd,   zd+ = M(z+)^-1 p+. */
ROLN_FN roln_status rolni_midpoint(const roln_lnn *f, int T, int nb, const roln_real *theta, const roln_force *force,
                                   roln_real h, const roln_real *s, roln_real *sn, roln_real *tape, int stride,
                                   roln_real *work)
{
    const int n = f->n, m = nb * n;
    roln_real *p = work, *F = p + m, *sm = F + m, *v = sm + m, *rhs = v + m, *w = rhs + m, *last = tape + 2 * stride;
    const rolni_tape t0 = rolni_tape_of(f, T, nb, tape), tm = rolni_tape_of(f, T, nb, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, T, nb, last);
    roln_real change = 0, size = 1;
    roln_status st;
    int it, i, r;
    if ((st = rolni_eval(f, T, nb, theta, s, 0, tape, w)) != ROLN_OK) return st;
    rolni_mass_mul(n, nb, &t0, s + m, p, w);
    memcpy(v, s + m, (size_t)m * sizeof *v);
    for (it = 0;; it++) {
        for (i = 0; i < m; i++)
            sm[i] = s[i] + h / 2 * v[i];
        if (force) force->eval(force->ctx, nb, sm, F);
        if ((st = rolni_eval(f, T, nb, theta, sm, 0, tape + stride, w)) != ROLN_OK) return st;
        for (i = 0; i < m; i++) {
            F[i] = tm.kin[i] - tm.g[i] + (force ? F[i] : 0);
            rhs[i] = p[i] + h / 2 * F[i];
        }
        if (it == ROLN_MIDPOINT_ITERS) break;
        for (r = 0; r < nb; r++)
            rolni_minv(n, tm.R + r * n * n, tm.el + r * n, rhs + r * n, w, w + n), memcpy(rhs + r * n, w, (size_t)n * sizeof *w);
        for (change = 0, i = 0; i < m; i++) {
            const roln_real d = ROLN_ABS(rhs[i] - v[i]);
            change = d > change || !roln_finite(d) ? d : change;
            size = ROLN_ABS(rhs[i]) > size ? ROLN_ABS(rhs[i]) : size;
            v[i] = rhs[i];
        }
    }
    if (!(change <= 1000 * ROLN_EPS * size) || !roln_finite(change)) return ROLN_E_NO_CONVERGENCE;
    for (i = 0; i < m; i++) {
        p[i] += h * F[i];
        sm[i] = s[i] + h * v[i];
    }
    if ((st = rolni_eval(f, T, nb, theta, sm, 0, last, w)) != ROLN_OK) return st;
    for (r = 0; r < nb; r++)
        rolni_minv(n, t1.R + r * n * n, t1.el + r * n, p + r * n, t1.zdd + r * n, w);
    memcpy(sn, sm, (size_t)m * sizeof *sn);
    memcpy(sn + m, t1.zdd, (size_t)m * sizeof *sn);
    return ROLN_OK;
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
    const roln_real *v = tm.x + 2 * m;
    roln_real *gz = work, *gp = gz + m, *mu = gp + m, *a = mu + m, *gm = a + m, *gv = gm + m, *zero = gv + m, *w = zero + m;
    int it, i, r;
    memset(work, 0, (size_t)(7 * m) * sizeof *work);
    for (r = 0; r < nb; r++)
        rolni_minv(n, t1.R + r * n * n, t1.el + r * n, gsn + m + r * n, gp + r * n, w);
    memcpy(gz, gsn, (size_t)m * sizeof *gz);
    rolni_adjoint(f, nb, theta, tape + 2 * stride, 0, zero, gp, t1.zdd, gz, NULL, gtheta, w);
    for (it = 0;; it++) {
        const int final = it == ROLN_MIDPOINT_ITERS;
        memset(gm, 0, (size_t)(2 * m) * sizeof *gm);
        for (i = 0; i < m; i++)
            a[i] = h * gp[i] + h / 2 * mu[i];
        rolni_adjoint(f, nb, theta, tape + stride, 0, a, mu, v, gm, gv, final ? gtheta : NULL, w);
        if (force) force->bwd(force->ctx, nb, tm.x, a, final, gm);
        if (final) break;
        for (i = 0; i < m; i++)
            gv[i] += h * gz[i] + h / 2 * gm[i];
        for (r = 0; r < nb; r++)
            rolni_minv(n, tm.R + r * n * n, tm.el + r * n, gv + r * n, mu + r * n, w);
    }
    for (i = 0; i < m; i++) { /* p = M(z) zd */
        gs[i] += gz[i] + gm[i];
        gp[i] = -(gp[i] + mu[i]);
    }
    rolni_adjoint(f, nb, theta, tape, 0, zero, gp, t0.x + 2 * m, gs, NULL, gtheta, w);
    rolni_mass_mul(n, nb, &t0, gp, gv, w);
    for (i = 0; i < m; i++)
        gs[m + i] -= gv[i];
}

/* One step of length h from s to sn, both [2][nb][n] (sn may be s); force may be NULL. tape: ROLN_STAGES(scheme) tapes of
   size ROLN_LNN_TAPE(n, hidden, 2, nb) for T = 2, one of ROLN_LNN_TAPE(n, hidden, 1, nb) for T = 1.
   work [ROLN_STEP_WORK(n, wide, T, nb)]. sn is written only on ROLN_OK. ROLN_E_NO_CONVERGENCE: h too long for midpoint. */
ROLN_FN roln_status roln_lnn_step(const roln_lnn *f, int scheme, int T, int nb, const roln_real *theta,
                                  const roln_force *force, roln_real h, const roln_real *s, roln_real *sn, roln_real *tape,
                                  roln_real *work)
{
    static const roln_real weight[4] = {ROLN_C(1.0) / 6, ROLN_C(1.0) / 3, ROLN_C(1.0) / 3, ROLN_C(1.0) / 6};
    const int n = f->n, m2 = 2 * nb * n, stride = T > 1 ? ROLN_LNN_TAPE(n, roln_mlp_hidden(&f->mass), T, nb) : 0;
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
   through force->bwd, to what the force depends on. gs may not be gsn. work [ROLN_STEP_WORK(n, wide, 2, nb)]. */
ROLN_FN void roln_lnn_step_bwd(const roln_lnn *f, int scheme, int nb, const roln_real *theta, const roln_force *force,
                               roln_real h, roln_real *tape, const roln_real *gsn, roln_real *gs, roln_real *gtheta,
                               roln_real *work)
{
    static const roln_real weight[4] = {ROLN_C(1.0) / 6, ROLN_C(1.0) / 3, ROLN_C(1.0) / 3, ROLN_C(1.0) / 6};
    const int n = f->n, m2 = 2 * nb * n, stride = ROLN_LNN_TAPE(n, roln_mlp_hidden(&f->mass), 2, nb);
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

#endif
