/* SPDX-License-Identifier: MIT */
/* roln_lnn.h - Lagrangian neural network: a learned mass matrix, potential and dissipation, and the motion they imply.

       M(z) zdd + C(z,zd) zd + g(z) + d(z,zd) = tau_z        M = exp_P(U(z)),  g = dV/dz,  d = L L^T zd + c o tanh(zd / v)

   d may also have quadratic drag W (|y| o y), y = W^T zd, and another law of friction (section 4). u, V, L and W are multilayer
   perceptrons or polynomials of z, or of cos z_j and sin z_j where z_j is an angle. U is the symmetric matrix filled from u, exp_P
   the exponential map at the base point P, so M is positive definite whatever the weights. Behind the exponential SPD layers may
   follow; or M = L L^T + floor I takes its place. L, filled from u, is a triangle (Cholesky, as in DeLaN), or n rows of n or more
   numbers (squares). C comes from the Christoffel symbols of M:

       c = C zd = DM[zd] zd - 1/2 grad_z (zd^T M zd)

   one directional derivative and one gradient; neither dM/dz nor, with the exponential, M^-1 is ever formed.
   After Friedl et al., ICLR 2025, Eqs. 4-8 and section 3.1. The paper differentiates M entry by entry; the form of c above and
   the backward that is built on it are roln's own.

   1 networks            perceptrons and polynomials: forward, backward, initial weights
   2 shape and layout    sizes, where the parts of theta lie, the tape
   3 mass matrix         from u to M and back, row by row
   4 mechanics           one sweep forward, one back; forward and inverse dynamics, terms
   5 integrators         explicit Euler, Runge-Kutta, variational midpoint, leapfrog; steps with stiction; the start from two
                         positions

   Samples come in blocks of nb rows, state s = [z; zd] as [2][nb][n]. Forward functions fill a tape; backward functions
   read the tape, add to their outputs and skip those that are NULL. Complete without roln.h. */

#ifndef ROLN_LNN_H
#define ROLN_LNN_H

#include "roln_spd.h"

/* ---- 1 networks ------------------------------------------------------------------------------- */

#define ROLN_MLP_MAX 6 /* layers at most, the linear output layer included */

/* A perceptron: fully connected, with softplus between its layers and a linear output. Or polynomials: layers is 2, and the hidden
   layer has no weights. It is the inputs x, and behind them p(x), the polynomials of degree 2 .. degree (roln_spd.h, 9). */
typedef struct {
    int layers;
    int size[ROLN_MLP_MAX + 1]; /* input, hidden .., output */
    int degree;                 /* of polynomials, 2 .. ROLN_DEGREE_MAX; 0: softplus */
} roln_mlp;

/* theta holds for each layer W and b. W is [in][out] in hidden layers and [out][in] in the output layer: the wide,
   hidden side is contiguous. */
ROLN_FN int roln_mlp_params(const roln_mlp *f)
{
    int l, sum = 0;
    for (l = f->degree > 0; l < f->layers; l++)
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

/* Largest size of the layers first, first + 2 .. below the output; layer 0 is the input. */
ROLN_FN int roln_mlp_widest(const roln_mlp *f, int first)
{
    int l, wide = 0;
    for (l = first; l < f->layers; l += 2)
        wide = ROLN_MAX(wide, f->size[l]);
    return wide;
}

/* The hidden layer of polynomials: their values and derivatives along the planes, as roln_mlp_forward has them. */
ROLN_FN void rolni_mlp_polynomials(const roln_mlp *f, int value, int planes, int nb, const roln_real *x, roln_real *slope,
                                   roln_real *out)
{
    const int n = f->size[0], F = f->size[1];
    int p, r;
    for (p = 0; p < planes; p++)
        for (r = 0; r < nb; r++, x += n, out += F) {
            rolni_copy(n, x, out);
            if (p < value) {
                rolni_polynomials(n, f->degree, 1, out, 0, out + n, 0);
                rolni_copy(F, out, slope + r * F);
            } else {
                rolni_polynomials_along(n, f->degree, slope + r * F, slope + r * F + n, x, out + n);
            }
        }
}

/* Backward of the polynomials y [F] of one sample. Adds to gx [n] the cotangent of the inputs. gy [F]: cotangent of y; NULL: 0.
   yt [F] = Dy[x] are the derivatives along a direction x, and x is their first n numbers; NULL: no direction. gyt [F]: cotangent of
   yt. Adds to gxt [n] the cotangent of x, unless gxt is NULL. work [2 F], with a direction [4 F]. */
ROLN_FN void rolni_mlp_polynomials_bwd(const roln_mlp *f, const roln_real *y, const roln_real *gy, const roln_real *yt,
                                    const roln_real *gyt, roln_real *gx, roln_real *gxt, roln_real *work)
{
    const int n = f->size[0], F = f->size[1];
    roln_real *const at = work, *const g = work + (yt ? 2 : 1) * F;
    int i;
    rolni_copy(F, y, at);
    if (gy) rolni_copy(F, gy, g);
    else rolni_zero(F, g);
    if (yt) rolni_copy(F, yt, at + F), rolni_copy(F, gyt, g + F);
    rolni_polynomials_bwd(n, f->degree, yt ? 2 : 1, at, F, at + n, F, g + n, g);
    for (i = 0; i < n; i++)
        gx[i] += g[i];
    for (i = 0; i < n && gxt; i++)
        gxt[i] += g[F + i];
}

/* Planes of a block, together. If value, plane 0 is the value y = f(x), and slope is written; all others are directional
   derivatives y_t = Df(x)[x_t], which read slope. x [planes][nb][in], theta in; y [planes][nb][out] out;
   slope [nb * hidden]: softplus'(a) of each hidden layer, [nb][size] one layer after the other; of polynomials their values;
   out [planes * nb * hidden]: the outputs of each hidden layer, [planes][nb][size] one layer after the other. */
ROLN_FN void roln_mlp_forward(const roln_mlp *f, int value, int planes, int nb, const roln_real *theta, const roln_real *x,
                              roln_real *y, roln_real *slope, roln_real *out)
{
    const roln_real *in = x;
    int l = f->degree > 0, r, i, p;
    if (l) rolni_mlp_polynomials(f, value, planes, nb, x, slope, out), in = out;
    for (; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1], rows = nb * no, last = l + 1 == f->layers;
        const roln_real *b = theta + ni * no;
        roln_real *to = last ? y : out;
        if (last) roln_mm_bt(planes * nb, ni, no, in, theta, to);
        else roln_mm(planes * nb, ni, no, in, theta, to);
        for (r = 0; r < nb && value; r++)
            for (i = ROLNI_MVE_EACH(0, no, b, to + r * no); i < no; i++)
                to[r * no + i] += b[i];
        theta = b + no;
        in = to;
        if (last) continue;
        if (value) roln_softplus_n(rows, to, to, slope);
        for (p = value; p < planes; p++)
            for (i = ROLNI_MVE_EACH(1, rows, slope, to + p * rows); i < rows; i++)
                to[p * rows + i] *= slope[i];
        slope += rows;
        out += planes * rows;
    }
}

/* A plane for the backward, which takes planes from several calls of roln_mlp_forward. */
typedef struct {
    const roln_real *x;   /* [nb][in] its input */
    const roln_real *out; /* `out` of the call that made it */
    int planes, at;       /* planes of that call, and which of them this is */
} roln_mlp_plane;

/* The input of layer l, [nb][size[l]]; below: sum of the hidden sizes before layer l. */
ROLN_FN const roln_real *rolni_plane_input(const roln_mlp *f, const roln_mlp_plane *plane, int l, int nb, int below)
{
    return l == 0 ? plane->x : plane->out + nb * (plane->planes * below + plane->at * f->size[l]);
}

/* Backward. plane [planes] in, plane 0 the value; may be NULL where planes = 1 and gtheta is NULL. slope of the value,
   gy [planes][nb][out] in; adds to gx [planes][nb][in] and gtheta (each may be NULL). work: the cotangents of two
   neighbouring layers; wide = roln_mlp_widest(f, 0) + roln_mlp_widest(f, 1); of polynomials 2 hidden more, behind these, with
   planes > 1 4 hidden. */
#define ROLN_MLP_BWD_WORK(planes, nb, wide) ((planes) * (nb) * (wide))
ROLN_FN void roln_mlp_bwd(const roln_mlp *f, int planes, int nb, const roln_real *theta, const roln_mlp_plane *plane,
                          const roln_real *slope, const roln_real *gy, roln_real *gx, roln_real *gtheta, roln_real *work)
{
    const int rows = planes * nb;
    const roln_real *g = gy, *end = theta + roln_mlp_params(f);
    roln_real *const odd = work + rows * roln_mlp_widest(f, 0);
    int l, r, i, t, below = roln_mlp_hidden(f);
    for (l = f->layers - 1; l >= 0; l--) {
        const int ni = f->size[l], no = f->size[l + 1], last = l + 1 == f->layers, m = nb * ni;
        const roln_real *b = end - no, *W = b - ni * no;
        roln_real *gn = l % 2 ? odd : work;
        below -= l > 0 ? ni : 0;
        if (gtheta) { /* the inputs of all planes, one after the other, lie where gn will be */
            roln_real *gb = gtheta + (b - theta), *gW = gtheta + (W - theta);
            const roln_real *in = planes == 1 ? rolni_plane_input(f, plane, l, nb, below) : gn;
            for (t = 0; t < planes && planes > 1; t++)
                rolni_copy(m, rolni_plane_input(f, plane + t, l, nb, below), gn + t * m);
            if (last) roln_mm_at(no, rows, ni, g, in, gW);
            else roln_mm_at(ni, rows, no, in, g, gW);
            for (r = 0; r < nb; r++)
                for (i = 0; i < no; i++)
                    gb[i] += g[r * no + i];
        }
        if (l == 0 && !gx) return;
        if (last) roln_mm(rows, no, ni, g, W, gn);
        else roln_mm_bt(rows, no, ni, g, W, gn);
        if (l > 0 && f->degree > 0) {
            const int in = f->size[0];
            for (r = 0; r < nb && gx; r++)
                for (t = planes > 1; t < ROLN_MAX(planes, 1); t++)
                    rolni_mlp_polynomials_bwd(f, slope + r * ni, t > 1 ? NULL : gn + r * ni,
                                           t > 0 ? rolni_plane_input(f, plane + t, 1, nb, 0) + r * ni : NULL,
                                           gn + (t * nb + r) * ni, gx + r * in, t > 0 ? gx + (t * nb + r) * in : NULL,
                                           work + rows * (in + ni));
            return;
        }
        if (l > 0) { /* y = softplus(a), y_t = s a_t, s' = s (1 - s): ga = s gy + (1 - s) sum_t gy_t y_t, ga_t = s gy_t */
            const roln_real *s = slope + nb * below;
            for (i = 0; i < m; i++)
                gn[i] *= s[i];
            for (t = 1; t < planes; t++) {
                const roln_real *y = rolni_plane_input(f, plane + t, l, nb, below);
                for (i = 0; i < m; i++) {
                    gn[i] += (1 - s[i]) * gn[t * m + i] * y[i];
                    gn[t * m + i] *= s[i];
                }
            }
        }
        g = gn;
        end = W;
    }
    for (i = 0; i < rows * f->size[0]; i++)
        gx[i] += g[i];
}

/* Backward of the value alone, which keeps what it passes: from gy [nb][out] in the cotangents ga of what each softplus takes, out,
   which lie as `out` of roln_mlp_forward does, on plane 0 of `planes`, and gx [nb][in] out. The same bits as roln_mlp_bwd. Of
   polynomials ga are their cotangents. work [2 hidden] of polynomials, else not used. */
ROLN_FN void roln_mlp_gradient(const roln_mlp *f, int planes, int nb, const roln_real *theta, const roln_real *slope,
                               const roln_real *gy, roln_real *ga, roln_real *gx, roln_real *work)
{
    const roln_real *g = gy, *W = theta + roln_mlp_params(f);
    int l, i, below = nb * roln_mlp_hidden(f);
    if (f->degree > 0) {
        const int n = f->size[0], F = f->size[1];
        roln_mm(nb, f->size[2], F, gy, theta, ga);
        rolni_zero(nb * n, gx);
        for (i = 0; i < nb; i++)
            rolni_mlp_polynomials_bwd(f, slope + i * F, ga + i * F, NULL, NULL, gx + i * n, NULL, work);
        return;
    }
    for (l = f->layers - 1; l >= 0; l--) {
        const int ni = f->size[l], no = f->size[l + 1], m = nb * ni;
        roln_real *gn = gx;
        W -= (ni + 1) * no;
        if (l > 0) below -= m, gn = ga + planes * below;
        if (l + 1 == f->layers) roln_mm(nb, no, ni, g, W, gn);
        else roln_mm_bt(nb, no, ni, g, W, gn);
        i = 0;
        if (l > 0) i = ROLNI_MVE_EACH(1, m, slope + below, gn);
        for (; i < m; i++)
            gn[i] = l > 0 ? gn[i] * slope[below + i] : 0 + gn[i]; /* 0 + makes -0 a 0 */
        g = gn;
    }
}

/* y_i = c_i x_i; y may be x. */
ROLNI_INLINE void rolni_times_each(int n, const roln_real *ROLN_RESTRICT c, const roln_real *x, roln_real *y)
{
    int i;
    for (i = 0; i < n; i++)
        y[i] = c[i] * x[i];
}

/* roln_mlp_hessian of polynomials: for each direction j the gradient h of gy^T Dy[x_j] by the inputs, H_jk = h . x_k. */
#define ROLNI_POLYNOMIALS_HESSIAN_MEM(X, k, in, hidden) \
    X(e, in) X(h, in) X(yj, hidden) X(yv, ((k) > 1) * (hidden)) X(y2, ((k) > 1) * (hidden))
#define ROLN_POLYNOMIALS_HESSIAN_WORK(k, in, hidden) (0 ROLNI_POLYNOMIALS_HESSIAN_MEM(ROLNI_SIZE, k, in, hidden) + 4 * (hidden))
ROLN_FN void rolni_polynomials_hessian(const roln_mlp *f, int m, const roln_real *W, const roln_real *slope,
                                       const roln_mlp_plane *ga, const roln_mlp_plane *along, const roln_real *x, roln_real *y,
                                       roln_real *H, roln_real *work)
{
    const int n = f->size[0], F = f->size[1], out = f->size[2];
    const roln_real *v = along ? rolni_plane_input(f, along, 1, 1, 0) : NULL;
    int i, j, k;
    ROLNI_POLYNOMIALS_HESSIAN_MEM(ROLNI_CARVE, along ? 2 : 1, n, F)
    for (j = 0; j < m; j++) {
        for (i = 0; i < n; i++)
            yj[i] = x ? x[j * n + i] : ROLNI_AS(roln_real, i == j), h[i] = 0;
        rolni_polynomials_along(n, f->degree, slope, slope + n, yj, yj + n);
        rolni_mlp_polynomials_bwd(f, slope, NULL, yj, rolni_plane_input(f, ga, 1, 1, 0), h, NULL, work);
        for (k = 0; k <= j; k++) {
            const roln_real s = x ? roln_dot(n, h, x + k * n) : h[k];
            H[j * m + k] += s;
            if (k < j) H[k * m + j] += s;
        }
        if (!y) continue;
        roln_mm_bt(1, F, out, yj, W, y + j * out);
        if (!along) continue;
        {
            const roln_real *const by[2] = {v, yj}, *const pby[2] = {v + n, yj + n};
            rolni_polynomials_mixed(n, f->degree, slope, slope + n, by, pby, yv + n);
        }
        for (i = 0; i < n; i++)
            yv[i] = e[i] = x ? x[(m + j) * n + i] : 0;
        rolni_polynomials_along(n, f->degree, slope, slope + n, e, y2);
        for (i = 0; i < F - n; i++)
            yv[n + i] += y2[i];
        roln_mm_bt(1, F, out, yv, W, y + (m + j) * out);
    }
}

/* Derivatives of one sample along m directions together, of first and second order:
       a_j = W^T y_j,  y_j = s a_j          and, with `along`, the plane of a direction v, those along v and j at once,
       a_vj = W^T y_vj,  y_vj = s a_vj + (1 - s) y_v a_j
   x [m][in] in: D x[j], with `along` behind them D^2 x[v, j], [2][m][in]; NULL: the unit vectors, m = in. y [m][out] or [2][m][out]
   out, NULL: not wanted. Adds to H [m][m] the second derivatives of gy^T f, if D^2 x = 0,
       H_jk += sum_i (1 - s_i) ga_i a_ji a_ki   over all hidden layers, of which there is one at least,
   where the plane ga holds the cotangents of roln_mlp_gradient for gy. Behind c, row and sums, work holds a of two layers. Of
   polynomials it is ROLN_POLYNOMIALS_HESSIAN_WORK, k = 2 with `along`, else 1. */
#define ROLN_MLP_HESSIAN_MEM(X, m, wide) X(c, wide) X(row, wide) X(sums, m)
#define ROLN_MLP_HESSIAN_WORK(planes, m, wide) (0 ROLN_MLP_HESSIAN_MEM(ROLNI_SIZE, m, wide) + (planes) * (wide))
ROLN_FN void roln_mlp_hessian(const roln_mlp *f, int m, const roln_real *theta, const roln_real *slope, const roln_mlp_plane *ga,
                              const roln_mlp_plane *along, const roln_real *x, roln_real *y, roln_real *H, roln_real *work)
{
    const int planes = along ? 2 * m : m, wide = roln_mlp_widest(f, 0) + roln_mlp_widest(f, 1);
    const roln_real *in = x, *s = slope;
    int l, i, j, k, below = 0;
    if (f->degree > 0) {
        rolni_polynomials_hessian(f, m, theta, slope, ga, along, x, y, H, work);
        return;
    }
    ROLN_MLP_HESSIAN_MEM(ROLNI_CARVE, m, wide)
    roln_real *const odd = work + planes * roln_mlp_widest(f, 0);
    for (l = 0; l + 1 < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1];
        const roln_real *g = rolni_plane_input(f, ga, l + 1, 1, below);
        const roln_real *yv = along ? rolni_plane_input(f, along, l + 1, 1, below) : NULL;
        roln_real *a = l % 2 ? work : odd, *av = a + m * no;
        if (in) {
            roln_mm(planes, ni, no, in, theta, a);
        } else { /* unit vectors: the rows of W */
            rolni_copy(m * no, theta, a);
            if (along) rolni_zero(m * no, av);
        }
        for (i = 0; i < no; i++)
            c[i] = (1 - s[i]) * g[i];
        for (j = 0; j < m; j++) {
            rolni_times_each(no, c, a + j * no, row);
            roln_mm_bt(1, no, j + 1, row, a, sums);
            for (k = 0; k <= j; k++) {
                H[j * m + k] += sums[k];
                if (k < j) H[k * m + j] += sums[k];
            }
        }
        for (i = 0; i < no && along; i++)
            c[i] = (1 - s[i]) * yv[i];
        for (j = 0; j < m * no && along; j += no)
            for (i = 0; i < no; i++)
                av[j + i] = s[i] * av[j + i] + c[i] * a[j + i];
        for (j = 0; j < m * no && (y || l + 2 < f->layers); j += no)
            rolni_times_each(no, s, a + j, a + j);
        theta += (ni + 1) * no;
        in = a;
        s += no;
        below += no;
    }
    if (y) roln_mm_bt(planes, f->size[l], f->size[l + 1], in, theta, y);
}

/* Random weights: xavier-normal, gain sqrt 2 in hidden layers, `out` in the output layer, biases 0. Those of polynomials are small,
   with a deviation of 1e-3 and without gain. */
ROLN_FN void roln_mlp_init(const roln_mlp *f, roln_real out, roln_real *theta, uint64_t *seed)
{
    int l, i;
    for (l = f->degree > 0; l < f->layers; l++) {
        const int ni = f->size[l], no = f->size[l + 1];
        const roln_real gain = l + 1 < f->layers ? 2 : out * out, xavier = ROLN_SQRT(gain * 2 / ROLNI_AS(roln_real, ni + no));
        const roln_real sd = f->degree > 0 ? ROLN_C(1e-3) : xavier;
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

enum { ROLN_EXPONENTIAL = 0, ROLN_CHOLESKY = 1 }; /* how u becomes a mass matrix */
enum { ROLN_GYRO = 1 };                           /* the kind of an SPD layer, see section 3 */

/* Shape of a Lagrangian network. All its perceptrons have the same hidden sizes. Polynomials of M and R are of one degree, those of
   V of their own. */
typedef struct {
    int n;                  /* degrees of freedom */
    int mass;               /* ROLN_EXPONENTIAL: X_0 = exp_P(U); ROLN_CHOLESKY: M = L L^T + floor I */
    int squares;            /* Cholesky: columns of L, at least n, all of whose entries are in u; 0: L is lower triangular */
    int base;               /* exponential: 0: base point I, 1: learned P */
    int layers;             /* gyro layers behind the exponential: X_i+1 = layer_i(X_i), the last is M; Cholesky: 0 */
    int damping;            /* 1: learned dissipation R(z) = L L^T; 2: quadratic drag W(z) beside it */
    roln_real eigenvalue_floor; /* smallest eigenvalue of ROLN_CHOLESKY */
    roln_mlp mass_net;      /* z -> u, ROLN_TRI(n) outputs, with squares n squares */
    roln_mlp potential_net; /* z -> V, one output */
    roln_mlp damper_net;    /* z -> L, ROLN_TRI(n) outputs, and W [n][n] behind them if damping is 2 */
    uint32_t angles;        /* bit j: z_j is an angle in radians, on the circle. Then n <= ROLN_ANGLES_MAX, and the networks
                               have an input more for each angle: z_j or cos z_j, behind them sin z_j of the angles */
    int friction;           /* 1: learned dry friction, d_j += c_j tanh(zd_j / v_j), c_j, v_j > 0; 2: the law of rolni_law;
                               -1, -2: their numbers are in theta and no such force is in d: see roln_lnn_stick */
    int driven;             /* the accelerations of the last `driven` coordinates are prescribed; not by the midpoint rule */
} roln_lnn;

/* Outputs of the damper network, and numbers of the law of friction, of which there are n. */
#define ROLNI_DAMPER(damping, n) (((damping) > 0) * ROLN_TRI(n) + ((damping) > 1) * (n) * (n))
#define ROLNI_LAW(friction) ((friction) > 1 || (friction) < -1 ? 6 : (friction) != 0 ? 2 : 0)

#define ROLN_ANGLES_MAX 31

/* Nonzero if z_i is an angle. */
ROLNI_INLINE int roln_lnn_angle(const roln_lnn *f, int i)
{
    return f->angles != 0 && ((f->angles >> i) & 1) != 0;
}

/* b or, if z_i is an angle, that of its turns b + 2 pi k which is next to a. */
ROLNI_INLINE roln_real roln_lnn_near(const roln_lnn *f, int i, roln_real a, roln_real b)
{
    const roln_real d = a - b;
    return !roln_lnn_angle(f, i) || (d > -ROLNI_PI && d <= ROLNI_PI) ? b : a - roln_wrap(d);
}

/* theta holds the networks (mass, potential and, if damping, damper), the numbers of friction, P if base, and of each SPD layer the
   triangle of W, then B [n][n]. The numbers of friction are log c and log v [n]; with friction 2 then log s, log w, log l and
   atanh a [n]. These functions return the index at which a part begins. */
ROLN_FN int rolni_potential_at(const roln_lnn *f)
{
    return roln_mlp_params(&f->mass_net);
}

ROLN_FN int rolni_damper_at(const roln_lnn *f)
{
    return rolni_potential_at(f) + roln_mlp_params(&f->potential_net);
}

ROLN_FN int rolni_friction_at(const roln_lnn *f)
{
    return rolni_damper_at(f) + (f->damping ? roln_mlp_params(&f->damper_net) : 0);
}

ROLN_FN int rolni_base_at(const roln_lnn *f)
{
    return rolni_friction_at(f) + ROLNI_LAW(f->friction) * f->n;
}

ROLN_FN int rolni_layer_at(const roln_lnn *f, int layer)
{
    const int nn = f->n * f->n;
    return rolni_base_at(f) + (f->base ? nn : 0) + layer * (ROLN_TRI(f->n) + nn);
}

ROLN_FN int roln_lnn_params(const roln_lnn *f)
{
    return rolni_layer_at(f, f->layers);
}

/* Columns of L, and outputs of the mass network. */
ROLN_FN int rolni_columns(const roln_lnn *f)
{
    return f->squares > 0 ? f->squares : f->n;
}

ROLN_FN int rolni_outputs(const roln_lnn *f)
{
    return f->squares > 0 ? f->n * f->squares : ROLN_TRI(f->n);
}

/* Random networks with small outputs, so that M is near I (and P = I), R near 0, W of drag near I / 4. Friction starts with
   c = v = e^-2, s = l = e^-4, w = e^-1, a = 0. SPD layers start as the identity: W = 1, B = I. */
ROLN_FN void roln_lnn_init(const roln_lnn *f, roln_real *theta, uint64_t *seed)
{
    const roln_real law[6] = {-2, -2, -4, -1, -4, 0};
    roln_real *th = theta + rolni_base_at(f);
    const int n = f->n;
    int i, j;
    roln_mlp_init(&f->mass_net, ROLN_C(0.1), theta, seed);
    if (f->mass == ROLN_CHOLESKY)
        for (i = 0; i < n; i++) /* L = I */
            theta[rolni_potential_at(f) - rolni_outputs(f) + i * (f->squares + 1)] = 1;
    roln_mlp_init(&f->potential_net, 1, theta + rolni_potential_at(f), seed);
    if (f->damping) roln_mlp_init(&f->damper_net, ROLN_C(0.1), theta + rolni_damper_at(f), seed);
    for (i = 0; f->damping > 1 && i < n; i++) /* drag is cubic in W: it would not be learned from 0 */
        theta[rolni_friction_at(f) - n * n + i * (n + 1)] = ROLN_C(0.25);
    for (j = 0; j < ROLNI_LAW(f->friction) * n; j++)
        theta[rolni_friction_at(f) + j] = law[j / n];
    for (j = 0; f->base && j < n * n; j++)
        *th++ = j % (n + 1) == 0;
    for (i = 0; i < f->layers; i++) {
        for (j = 0; j < ROLN_TRI(n); j++)
            *th++ = 1;
        for (j = 0; j < n * n; j++)
            *th++ = j % (n + 1) == 0;
    }
}

/* The networks of f and where their weights begin, the first `count` of which it has: of M, V and R. */
typedef struct {
    const roln_mlp *net[3];
    int at[3], count;
} rolni_nets;

ROLN_FN rolni_nets rolni_nets_of(const roln_lnn *f)
{
    rolni_nets all;
    all.net[0] = &f->mass_net, all.net[1] = &f->potential_net, all.net[2] = &f->damper_net;
    all.at[0] = 0, all.at[1] = rolni_potential_at(f), all.at[2] = rolni_damper_at(f);
    all.count = 2 + (f->damping > 0);
    return all;
}

/* Networks of factor z in place of z, without angles: the weights of their first layers times factor. Random networks of
   roln_lnn_init suit z of order one; behind a chart, where |z| <= 1 and about a half, they are next to linear, and training would
   first have to make them steeper. Polynomials stay as they are. */
ROLN_FN void roln_lnn_steepen(const roln_lnn *f, roln_real factor, roln_real *theta)
{
    const rolni_nets all = rolni_nets_of(f);
    int k, i;
    for (k = 0; k < all.count && f->mass_net.degree == 0; k++)
        for (i = 0; i < f->n * f->mass_net.size[1]; i++)
            theta[all.at[k] + i] *= factor;
}

/* Ignorable (cyclic) coordinates z_j: M, V and R do not depend on them, as on the angle about a vertical first axis. In all
   networks the weights of their inputs in the first layer are exactly 0, those of z_j or of cos z_j and sin z_j. So all derivatives
   by z_j are exactly 0, and (M zd)_j is conserved where no force and no friction acts on it. Training keeps these weights: the
   gradient by weights of an input that a network does not see is 0. Random weights are not 0. */

/* Nonzero if all weights of input i of the first layer are 0, or of the polynomials that depend on it. */
ROLN_FN int rolni_unseen(const roln_mlp *f, int i, const roln_real *theta)
{
    const int out = f->degree > 0 ? f->size[2] : f->size[1], terms = f->degree > 0 ? f->size[1] : 1;
    const roln_real *const w = f->degree > 0 ? theta : theta + i * out;
    rolni_powers t = rolni_first_powers();
    int h, k;
    for (h = 0; h < terms; h++, rolni_next_powers(f->size[0], &t))
        for (k = 0; k < out && (f->degree == 0 || t.power[i] > 0); k++)
            if (w[k * terms + h] != 0) return 0;
    return 1;
}

/* These weights, or their gradient, become 0. */
ROLN_FN void rolni_unsee(const roln_mlp *f, int i, roln_real *theta)
{
    rolni_powers t = rolni_first_powers();
    int h, k;
    if (f->degree == 0) rolni_zero(f->size[1], theta + i * f->size[1]);
    for (h = 0; h < f->size[1] && f->degree > 0; h++, rolni_next_powers(f->size[0], &t))
        for (k = 0; k < f->size[2] && t.power[i] > 0; k++)
            theta[k * f->size[1] + h] = 0;
}

/* gtheta of the inputs that a network does not see becomes 0. */
ROLN_FN void rolni_unseen_bwd(const roln_mlp *f, const roln_real *theta, roln_real *gtheta)
{
    int i;
    for (i = 0; i < f->size[0]; i++)
        if (rolni_unseen(f, i, theta)) rolni_unsee(f, i, gtheta);
}

/* The input of the networks that is sin z_j of an angle, and j of another coordinate. */
ROLN_FN int rolni_second_input(const roln_lnn *f, int j)
{
    int i, at = f->n;
    for (i = 0; i < j; i++)
        at += roln_lnn_angle(f, i);
    return roln_lnn_angle(f, j) ? at : j;
}

/* z_j becomes ignorable, 0 <= j < n. */
ROLN_FN void roln_lnn_ignore(const roln_lnn *f, int j, roln_real *theta)
{
    const rolni_nets all = rolni_nets_of(f);
    int k;
    for (k = 0; k < all.count; k++) {
        rolni_unsee(all.net[k], j, theta + all.at[k]);
        rolni_unsee(all.net[k], rolni_second_input(f, j), theta + all.at[k]);
    }
}

/* Nonzero if z_j is ignorable, 0 <= j < n. */
ROLN_FN int roln_lnn_ignores(const roln_lnn *f, int j, const roln_real *theta)
{
    const rolni_nets all = rolni_nets_of(f);
    int k, unseen = 1;
    for (k = 0; k < all.count; k++)
        unseen = unseen && rolni_unseen(all.net[k], j, theta + all.at[k]) &&
                 rolni_unseen(all.net[k], rolni_second_input(f, j), theta + all.at[k]);
    return unseen;
}

/* Room for the hidden layers of any network. */
ROLN_FN int rolni_hidden(const roln_lnn *f)
{
    const int mass = roln_mlp_hidden(&f->mass_net), potential = roln_mlp_hidden(&f->potential_net);
    return ROLN_MAX(mass, potential);
}

/* Nonzero if M itself is kept; else M = exp_P(U) is used from the eigenbasis of U and never formed. */
ROLN_FN int rolni_formed(const roln_lnn *f)
{
    return f->layers > 0 || f->mass == ROLN_CHOLESKY || f->driven > 0;
}

/* The sizes of a Lagrangian network that the macros below ask S for, S(n), S(base) ..; at run time they are local ints:
       n           degrees of freedom
       base        1: learned base point P             damping    1: learned dissipation; 2: drag, too
       friction    1, 2: learned dry friction          damper     outputs of the damper network, ROLNI_DAMPER
       cholesky    1: ROLN_CHOLESKY                    formed     1: ROLN_CHOLESKY, SPD layers or driven
       cossin      inputs of the networks, n + number of angles; 0 without angles
       hidden      roln_mlp_hidden of M and R          polynomials 1: in place of perceptrons
       wide        roln_mlp_widest(.., 0) + roln_mlp_widest(.., 1): largest of their inputs, H_2, H_4 plus largest of H_1, H_3, H_5
       back        2 hidden of polynomials, else 0     hidden_v, wide_v, back_v   the same of V
       planes_k    ROLN_MAX(k S(hidden), S(hidden_v)), k = 1, 2, 3
       cols        of L: n, or more with squares       outputs     of the mass network
       layers      SPD layers
   and these, each on a line of its own, so that no line of the preprocessor becomes long: what a row of a block takes,
       row_mass    ROLNI_MASS_ROW_WORK(S)              row_dm      ROLNI_DM_WORK(S)
       row_bwd     ROLNI_ROW_BWD_WORK(S, 0, 0)         row_bwd_k   ROLNI_ROW_BWD_WORK(S, k, 1), k = 0, 1, 2
       row_jac_k   ROLNI_MOTION_JAC_WORK(S, k), and of it
       curve_k     ROLNI_CURVATURE_WORK(S, k), k = 1, 2
       row_mass_0  ROLNI_MASS_ONLY_WORK(S)
       row_gradient_k, row_all_k   ROLNI_GRADIENT_ROW_WORK(S, k), ROLNI_ALL_ROW_WORK(S, k), k = 0, 1: keep
   what the derivatives of a step take,
       stage_1     ROLNI_STAGE_WORK(S, 1, 1)           step_1      ROLN_LNN_STEP_WORK(S, scheme, 1, 1)
       dissipation ROLNI_DISSIPATION_JAC_WORK(S)       zdd_jac     ROLN_LNN_ZDD_JAC_WORK(S)
       midpoint_row ROLNI_MIDPOINT_ROW_WORK(S)         stick_slopes ROLNI_STICK_SLOPES_WORK(S)
   and no more of them than a macro needs. */

/* Kept of an SPD layer, its output included: at the matrix, and for each direction. */
#define ROLN_LAYER_KEEP(n) (4 * (n) + 7 * (n) * (n))
#define ROLN_LAYER_KEEP_DIR(n) (5 * (n) * (n))

/* The size `cossin` at run time. */
ROLN_FN int rolni_cossin(const roln_lnn *f)
{
    return f->angles ? f->mass_net.size[0] : 0;
}

/* The tape of a block. dirs: directions in z that it holds: 1 (zd), or 2 in roln_lnn_inverse with a velocity w (w, zd).
   keep: 1 if a backward is to follow (then dirs = 1), else 0: then the traces of the networks are scratch. */
#define ROLNI_TAPE_MEM(X, S, dirs, keep, nb) \
    X(x, (1 + (dirs)) * (nb) * (S(n) + S(cossin)))                 /* [1+dirs][nb][n]   z, directions, zd last; rolni_net_input */ \
    X(u, (1 + (dirs)) * (nb) * S(outputs))                         /* [1+dirs][nb][outputs] mass network, along directions */ \
    X(v, nb)                                                       /* [nb]              potential */ \
    X(L, (nb) * S(damper))                                         /* [nb][outputs]     damper */ \
    X(kin, (nb) * S(n))                                            /* [nb][n]           1/2 grad_z (zd^T M w), w = zd if none */ \
    X(g, (nb) * S(n))                                              /* [nb][n]           dV/dz */ \
    X(dmv, (nb) * S(n))                                            /* [nb][n]           DM[zd] w */ \
    X(d, (nb) * S(n))                                              /* [nb][n]           R zd and friction, 0 without */ \
    X(zdd, (nb) * S(n))                                            /* [nb][n] */ \
    X(l, (keep) * (1 - S(cholesky)) * (nb) * S(n))                 /* [nb][n]           eigenvalues of A^-1 U A^-T, A A^T = P */ \
    X(el, (1 - S(formed)) * (nb) * S(n))                           /* [nb][n]           e^-l */ \
    X(Q, (nb) * S(n) * S(cols))                                 /* [nb][n][cols]     X_0 = Q^T e^l Q; Cholesky: L */ \
    X(K, (1 - S(cholesky)) * (nb) * S(n) * S(n))                   /* [nb][n][n]        exp[l_i, l_j] */ \
    X(R, S(base) * (nb) * S(n) * S(n))                             /* [nb][n][n]        X_0^-1 = R^T e^-l R; Q where P = I */ \
    X(M, S(formed) * (nb) * S(n) * S(n))                           /* [nb][n][n]        M, where it is formed */ \
    X(C, S(formed) * (nb) * S(n) * S(n))                           /* [nb][n][n]        its Cholesky factor */ \
    X(mass_slope, (keep) * (nb) * S(hidden))                       /* traces of the networks: see roln_mlp_forward */ \
    X(mass_out, (keep) * (1 + (dirs)) * (nb) * S(hidden)) \
    X(potential_slope, (keep) * (nb) * S(hidden_v)) \
    X(potential_out, (keep) * (nb) * S(hidden_v)) \
    X(damper_slope, (keep) * (S(damping) > 0) * (nb) * S(hidden)) \
    X(damper_out, (keep) * (S(damping) > 0) * (nb) * S(hidden))

#define ROLN_LNN_TAPE(S, dirs, keep, nb) (0 ROLNI_TAPE_MEM(ROLNI_SIZE, S, dirs, keep, nb))

/* Where things lie on a tape. */
#define ROLNI_NO_SIZE(x) 0
typedef struct {
    ROLNI_TAPE_MEM(ROLNI_FIELD, ROLNI_NO_SIZE, 0, 0, 0)
    roln_real *zd; /* the last direction of x */
} rolni_tape;

#define ROLNI_TAPE_SIZES(f) \
    const int n = (f)->n, base = (f)->base, damping = (f)->damping, damper = ROLNI_DAMPER((f)->damping, (f)->n); \
    const int cholesky = (f)->mass == ROLN_CHOLESKY, cols = rolni_columns(f), outputs = rolni_outputs(f); \
    const int formed = rolni_formed(f), hidden = roln_mlp_hidden(&(f)->mass_net), hidden_v = roln_mlp_hidden(&(f)->potential_net); \
    const int cossin = rolni_cossin(f)

/* ROLN_LNN_TAPE at run time. */
ROLN_FN int roln_lnn_tape(const roln_lnn *f, int dirs, int keep, int nb)
{
    ROLNI_TAPE_SIZES(f);
    return ROLN_LNN_TAPE(ROLNI_LOCAL, dirs, keep, nb);
}

ROLN_FN rolni_tape rolni_tape_of(const roln_lnn *f, int dirs, int keep, int nb, roln_real *work)
{
    ROLNI_TAPE_SIZES(f);
    rolni_tape t, *b = &t;
    ROLNI_TAPE_MEM(ROLNI_LAY, ROLNI_LOCAL, dirs, keep, nb)
    if (!base) t.R = t.Q;
    t.zd = t.x + dirs * nb * n;
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

/* L = the lower triangular matrix of u, in the same order, zeros above. */
ROLN_FN void rolni_low(int n, const roln_real *u, roln_real *L)
{
    int i, j;
    rolni_zero(n * n, L);
    for (i = 0; i < n; i++)
        L[i * n + i] = *u++;
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            L[i * n + j] = *u++;
}

/* L [n][columns] of u. */
ROLN_FN void rolni_of_u(const roln_lnn *f, const roln_real *u, roln_real *L)
{
    if (f->squares > 0) rolni_copy(f->n * f->squares, u, L);
    else rolni_low(f->n, u, L);
}

/* Backward of both: gu = diag G_ii, low G_ij in the order of u, where G is the cotangent of a symmetric (diag 1, low 2) or of
   a triangular matrix (1, 1). */
ROLN_FN void rolni_tri_bwd(int n, roln_real diag, roln_real low, const roln_real *G, roln_real *gu)
{
    int i, j;
    for (i = 0; i < n; i++)
        *gu++ = diag * G[i * n + i];
    for (i = 1; i < n; i++)
        for (j = 0; j < i; j++)
            *gu++ = low * G[i * n + j];
}

/* Y = Q^T X Q. work [n][n]. */
ROLN_FN void rolni_congr_t_set(int n, const roln_real *Q, const roln_real *X, roln_real *Y, roln_real *work)
{
    rolni_zero(n * n, Y);
    roln_congr_t(n, Q, X, Y, work);
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
ROLN_FN void rolni_apply(int n, const roln_real *Q, const roln_real *K, const roln_real *F, const roln_real *p, roln_real *y,
                         roln_real *work)
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
       F_t = Q X_t Q^T,   Y_t = Q^T (K o F_t) Q,   K_ij = f[l_i, l_j],   D_ijk = f[l_i, l_j, l_k]
   kind: f is ROLN_EXP or ROLN_LOG. */
typedef struct {
    roln_real *l, *f, *Q, *K, *F;
} rolni_spectrum;

/* f and K of the ascending l. log: within what exp can hold, for D is made of the differences of exp. */
ROLN_FN roln_status rolni_dd1(int kind, int n, const roln_real *l, roln_real *f, roln_real *K)
{
    roln_status st;
    if ((st = roln_map_values(n, kind, 0, l, f)) != ROLN_OK) return st;
    if (kind == ROLN_LOG && (st = roln_exp_range(n, f)) != ROLN_OK) return st;
    roln_map_dd1(n, kind, 0, l, f, K);
    return ROLN_OK;
}

/* D. log: differentiating exp(log X) = X twice, D_ijk = - exp[f_i, f_j, f_k] K_ij K_jk K_ik. work [n][n]. */
ROLN_FN void rolni_dd2(int kind, int n, const roln_real *l, const roln_real *f, const roln_real *K, roln_real *D, roln_real *work)
{
    int i, j, k;
    if (kind == ROLN_EXP) {
        roln_exp_dd2(n, l, K, D);
        return;
    }
    roln_exp_dd1(n, f, work);
    roln_exp_dd2(n, f, work, D);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (k = 0; k < n; k++)
                D[(i * n + j) * n + k] *= -(K[i * n + j] * K[j * n + k] * K[i * n + k]);
}

/* In the eigenbasis, in place: the cotangents Z_t of the planes of Y become those of X,
       Z_0 <- K o Z_0 + sum_t D2f[F_t, Z_t],   Z_t <- K o Z_t. */
ROLN_FN void rolni_spectral_eig_bwd(int n, int k, const roln_real *K, const roln_real *D, const roln_real *F, roln_real *Z)
{
    const int nn = n * n;
    int t, i;
    for (i = 0; i < nn; i++)
        Z[i] *= K[i];
    for (t = 1; t <= k; t++) {
        roln_exp_d2(n, D, F + (t - 1) * nn, Z + t * nn, Z);
        for (i = 0; i < nn; i++)
            Z[t * nn + i] *= K[i];
    }
}

/* Forward; s keeps what the backward needs. work [2 n n]. */
ROLN_FN roln_status rolni_spectral(int kind, int n, int k, const roln_real *X, const rolni_spectrum *s, roln_real *Y,
                                   roln_real *work)
{
    const int nn = n * n;
    roln_status st;
    int t, i;
    if ((st = roln_eig(n, X, s->l, s->Q, work)) != ROLN_OK) return st;
    if ((st = rolni_dd1(kind, n, s->l, s->f, s->K)) != ROLN_OK) return st;
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

/* Backward: the cotangents G [1+k][n][n] of Y become those of X. D, and then a copy of G, lie behind the product. */
#define ROLNI_SPECTRAL_BWD_WORK(n, k) ((n) * (n) + ROLN_MAX(((k) > 0) * (n) * (n) * (n), (n) * (n)))
ROLN_FN void rolni_spectral_bwd(int kind, int n, int k, const rolni_spectrum *s, roln_real *G, roln_real *work)
{
    const int nn = n * n;
    roln_real *product = work, *D = product + nn;
    int t;
    for (t = 0; t <= k; t++)
        roln_congr(n, s->Q, G + t * nn, G + t * nn, product);
    if (k > 0) rolni_dd2(kind, n, s->l, s->f, s->K, D, product);
    rolni_spectral_eig_bwd(n, k, s->K, D, s->F, G);
    for (t = 0; t <= k; t++) {
        rolni_copy(nn, G + t * nn, D);
        rolni_congr_t_set(n, s->Q, D, G + t * nn, product);
    }
}

/* The SPD layer (paper, section 3.1), on planes X [1+k][n][n] -> Y [1+k][n][n]:
       gyro     Y = E B E, E = exp(1/2 W o log X): gyro-translation by the SPD bias B of the matrix scaling of X by W
   Eigenvalues of X within what exp can hold, else ROLN_E_RANGE or ROLN_E_NOT_SPD.
   mem [ROLN_LAYER_KEEP + k ROLN_LAYER_KEEP_DIR] gets Y and what the backward needs; work [2 n n]. */
typedef struct {
    rolni_spectrum a, b;  /* of log and exp */
    roln_real *log_X, *E; /* log X, exp(1/2 W o log X) [1+k][n][n] */
    roln_real *Y;
} rolni_layer_mem;

ROLN_FN rolni_spectrum rolni_spectrum_of(int n, int k, roln_real **mem)
{
    rolni_spectrum s;
    s.l = *mem, s.f = s.l + n, s.Q = s.f + n, s.K = s.Q + n * n, s.F = s.K + n * n, *mem = s.F + k * n * n;
    return s;
}

ROLN_FN rolni_layer_mem rolni_layer_mem_of(int n, int k, roln_real *mem)
{
    rolni_layer_mem m;
    m.a = rolni_spectrum_of(n, k, &mem);
    m.b = rolni_spectrum_of(n, k, &mem);
    m.log_X = mem, m.E = m.log_X + (1 + k) * n * n, m.Y = m.E + (1 + k) * n * n;
    return m;
}

ROLN_FN roln_status rolni_layer(int n, int k, const roln_real *theta, const roln_real *X, const rolni_layer_mem *m, roln_real *work)
{
    const int nn = n * n;
    const roln_real *B = theta + ROLN_TRI(n);
    roln_real *Y = m->Y;
    roln_status st;
    int t, j;
    if ((st = rolni_spectral(ROLN_LOG, n, k, X, &m->a, m->log_X, work)) != ROLN_OK) return st;
    rolni_sym(n, theta, work);
    for (t = 0; t <= k; t++)
        for (j = 0; j < nn; j++)
            Y[t * nn + j] = work[j] * m->log_X[t * nn + j] / 2;
    if ((st = rolni_spectral(ROLN_EXP, n, k, Y, &m->b, m->E, work)) != ROLN_OK) return st;
    roln_congr(n, m->E, B, Y, work);
    for (t = 1; t <= k; t++) { /* E_t B E and its transpose */
        roln_mm(n, n, n, m->E + t * nn, B, work);
        roln_mm(n, n, n, work, m->E, work + nn);
        rolni_twice_sym(n, work + nn, Y + t * nn);
    }
    return ROLN_OK;
}

/* Backward of rolni_layer: the cotangents G of Y become those of X; gtheta added to (may be NULL). The first two
   lines of each loop follow from the product rule of Y_t = E_t B E + E B E_t. */
#define ROLNI_LAYER_BWD_WORK(S, k) ((S(layers) > 0) * ((1 + (k)) * S(n) * S(n) + ROLNI_SPECTRAL_BWD_WORK(S(n), k)))
ROLN_FN void rolni_layer_bwd(int n, int k, const roln_real *theta, roln_real *G, roln_real *gtheta, const rolni_layer_mem *m,
                             roln_real *work)
{
    const int nn = n * n;
    const roln_real *B = theta + ROLN_TRI(n);
    roln_real *gE = work, *rest = gE + (1 + k) * nn, *S = rest, *product = S + nn;
    int t, j;
    for (t = 0; t <= k; t++) { /* cotangents of E_t, and of E */
        roln_mm(n, n, n, m->E, B, product);
        roln_mm(n, n, n, G + t * nn, product, S);
        rolni_twice_sym(n, S, gE + t * nn);
        if (t == 0) continue;
        roln_mm(n, n, n, m->E + t * nn, B, product);
        roln_mm(n, n, n, G + t * nn, product, S);
        rolni_twice_sym(n, S, product);
        for (j = 0; j < nn; j++)
            gE[j] += product[j];
    }
    for (t = 0; gtheta && t <= k; t++) { /* g_B = E G_0 E + sum_t E_t G_t E + its transpose */
        roln_mm(n, n, n, m->E + t * nn, G + t * nn, product);
        roln_mm(n, n, n, product, m->E, S);
        rolni_twice_sym(n, S, product);
        for (j = 0; j < nn; j++)
            gtheta[ROLN_TRI(n) + j] += t == 0 ? product[j] / 2 : product[j];
    }
    rolni_spectral_bwd(ROLN_EXP, n, k, &m->b, gE, rest);
    rolni_zero(nn, S); /* gE is now the cotangent of 1/2 W o log X */
    rolni_sym(n, theta, product);
    for (t = 0; t <= k; t++)
        for (j = 0; j < nn; j++) {
            S[j] += gE[t * nn + j] * m->log_X[t * nn + j] / 2;
            G[t * nn + j] = gE[t * nn + j] * product[j] / 2;
        }
    rolni_tri_bwd(n, 1, 2, S, product);
    for (j = 0; gtheta && j < ROLN_TRI(n); j++)
        gtheta[j] += product[j];
    rolni_spectral_bwd(ROLN_LOG, n, k, &m->a, G, rest);
}

/* Row r of a tape, and up to two directions in u of that row. The functions of a row take the number k of its directions as an
   argument, like the shape f, so that a compiler which knows both drops what is not used. */
typedef struct {
    const roln_real *theta;
    const rolni_tape *tape;
    int r;
    const roln_real *u[2]; /* [outputs] each */
} rolni_row;

/* F_t = R U_t R^T of the k directions U_t of U; Cholesky: F_t = L_t. F [k][n][n] out. */
#define ROLNI_DIRECTIONS_WORK(S, k) (((k) > 0) * (1 - S(cholesky)) * 2 * S(n) * S(n))
ROLN_FN void rolni_directions(const roln_lnn *f, int k, const rolni_row *row, roln_real *F, roln_real *work)
{
    const int n = f->n, nn = n * n;
    int t;
    for (t = 0; t < k; t++) {
        if (f->mass == ROLN_CHOLESKY) {
            rolni_of_u(f, row->u[t], F + t * n * rolni_columns(f));
        } else {
            rolni_sym(n, row->u[t], work);
            roln_congr(n, row->tape->R + row->r * nn, work, F + t * nn, work + nn);
        }
    }
}

/* The chain of a row: its SPD matrices and those of its directions, [1+k][.][.] each, where they are formed: X_0, and behind it
   what each layer keeps, X_i+1 included. The size, and the same at run time. */
#define ROLNI_CHAIN(S, k) \
    (S(formed) * (1 + (k)) * S(n) * S(n) + S(layers) * (ROLN_LAYER_KEEP(S(n)) + (k) * ROLN_LAYER_KEEP_DIR(S(n))))
ROLN_FN int rolni_chain_size(const roln_lnn *f, int k)
{
    const int n = f->n, formed = rolni_formed(f), layers = f->layers;
    return ROLNI_CHAIN(ROLNI_LOCAL, k);
}

/* Fills the chain; F from rolni_directions, *M is the last matrix. The status depends on the matrices only, not on directions:
   where rolni_eval has formed M of a row, it is ROLN_OK ever after. */
#define ROLNI_FORM_WORK(S, k) \
    (S(cholesky) ? ((k) > 0) * S(n) * S(n) : S(formed) * (S(n) + ROLN_SPD_FORM_WORK(S(n))))
ROLN_FN roln_status rolni_form(const roln_lnn *f, int k, const rolni_row *row, const roln_real *F, roln_real *chain, roln_real **M,
                               roln_real *work)
{
    const int n = f->n, nn = n * n;
    const int cols = rolni_columns(f);
    const roln_real *Q = row->tape->Q + row->r * n * cols, *K = row->tape->K + row->r * nn;
    roln_real *X = chain, *end = X + (1 + k) * nn;
    int i, t;
    *M = X;
    if (f->mass == ROLN_CHOLESKY) { /* X_0 = L L^T + floor I, X_t = L_t L^T + L L_t^T */
        roln_mm_bt(n, cols, n, Q, Q, X);
        for (i = 0; i < n; i++)
            X[i * (n + 1)] += f->eigenvalue_floor;
        for (t = 0; t < k; t++) {
            roln_mm_bt(n, cols, n, F + t * n * cols, Q, work);
            rolni_twice_sym(n, work, X + (1 + t) * nn);
        }
    } else { /* X_0 = Q^T e^l Q, X_t = Q^T (K o F_t) Q */
        for (i = 0; i < n; i++)
            work[i] = K[i * (n + 1)];
        roln_spd_form(n, work, Q, X, work + n);
        for (t = 0; t < k; t++) {
            for (i = 0; i < nn; i++)
                work[i] = K[i] * F[t * nn + i];
            rolni_congr_t_set(n, Q, work, X + (1 + t) * nn, work + nn);
        }
    }
    for (i = 0; i < f->layers; i++) {
        const rolni_layer_mem mem = rolni_layer_mem_of(n, k, end);
        const roln_status st = rolni_layer(n, k, row->theta + rolni_layer_at(f, i), X, &mem, work);
        *M = X = mem.Y;
        if (st != ROLN_OK) return st;
        end += ROLN_LAYER_KEEP(n) + k * ROLN_LAYER_KEEP_DIR(n);
    }
    return ROLN_OK;
}

/* Backward of the layers, last first: the cotangents Z of M become those of X_0. The chain from rolni_form. */
ROLN_FN void rolni_chain_bwd(const roln_lnn *f, int k, const rolni_row *row, roln_real *chain, roln_real *Z, roln_real *gtheta,
                             roln_real *work)
{
    const int n = f->n, size = ROLN_LAYER_KEEP(n) + k * ROLN_LAYER_KEEP_DIR(n);
    int i;
    for (i = f->layers - 1; i >= 0; i--) {
        const rolni_layer_mem mem = rolni_layer_mem_of(n, k, chain + (1 + k) * n * n + i * size);
        const int at = rolni_layer_at(f, i);
        rolni_layer_bwd(n, k, row->theta + at, Z, gtheta ? gtheta + at : NULL, &mem, work);
    }
}

/* One bilinear form c p^T M_t q of a block, p and q [nb][n], and where its cotangents go: gp += c M_t q, gq += c M_t p
   (each may be NULL). M_0 is the mass matrix, M_1, M_2 its derivatives along the directions of a row. */
typedef struct {
    roln_real c;
    const roln_real *p, *q;
    roln_real *gp, *gq;
} rolni_pair;

/* v = M_t x of a row that is not formed, from y = Q x. work [n]. */
ROLN_FN void rolni_from_basis(const roln_lnn *f, const rolni_row *row, int t, const roln_real *F, const roln_real *y, roln_real *v,
                              roln_real *work)
{
    const int n = f->n;
    const roln_real *Q = row->tape->Q + row->r * n * n, *K = row->tape->K + row->r * n * n;
    int i;
    if (t > 0) {
        rolni_apply(n, Q, K, F + (t - 1) * n * n, y, v, work);
        return;
    }
    for (i = 0; i < n; i++)
        work[i] = K[i * (n + 1)] * y[i];
    roln_mm(1, n, n, work, Q, v);
}

/* Backward of the pairs with respect to their vectors, and the cotangents Z_t = c sym(p q^T) of M_t; in the eigenbasis, where M
   is not formed. M [1+k][n][n] from rolni_form, or F. Z [1+k][n][n] out. grad: 1 where a pair has a gp or gq. */
#define ROLNI_PAIRS_WORK(S, grad) (S(formed) ? (grad) * S(n) : (2 + 2 * (grad)) * S(n))
ROLN_FN void rolni_pairs_bwd(const roln_lnn *f, int k, const rolni_row *row, const rolni_pair *pair, const roln_real *M,
                             const roln_real *F, roln_real *Z, roln_real *work)
{
    const int n = f->n, nn = n * n, formed = rolni_formed(f);
    roln_real *x = work, *y = x + n, *v = formed ? work : y + n, *product = v + n;
    int t, i, j;
    for (t = 0; t <= k; t++) {
        const rolni_pair *of = pair + t;
        const roln_real *p = of->p + row->r * n, *q = of->q + row->r * n;
        roln_real *out[2];
        out[0] = of->gp, out[1] = of->gq;
        if (!formed) {
            roln_mm_bt(1, n, n, p, row->tape->Q + row->r * nn, x);
            roln_mm_bt(1, n, n, q, row->tape->Q + row->r * nn, y);
            p = x, q = y;
        }
        rolni_outer(n, of->c, p, q, Z + t * nn);
        for (j = 0; j < 2; j++) {
            if (!out[j]) continue;
            if (formed) roln_mm_bt(1, n, n, j ? p : q, M + t * nn, v);
            else rolni_from_basis(f, row, t, F, j ? p : q, v, product);
            for (i = 0; i < n; i++)
                out[j][row->r * n + i] += of->c * v[i];
        }
    }
}

/* Backward of L L^T: g_L = 2 (Z_0 L + sum_t Z_t L_t), g_L_t = 2 Z_t L. gu: the cotangents of u and its directions, one every
   `stride` numbers. work [2 n n], with k = 0 [n][n]. */
ROLN_FN void rolni_cholesky_bwd(const roln_lnn *f, int k, const rolni_row *row, const roln_real *F, const roln_real *Z,
                                roln_real *gu, int stride, roln_real *work)
{
    const int n = f->n, nn = n * n, cols = rolni_columns(f), nc = n * cols;
    roln_real *G = work, *product = G + nc;
    int t, j, i;
    for (t = 0; t <= k; t++) {
        roln_mm(n, n, cols, Z + t * nn, row->tape->Q + row->r * nc, G);
        for (j = 0; t == 0 && j < k; j++) {
            roln_mm(n, n, cols, Z + (1 + j) * nn, F + j * nc, product);
            for (i = 0; i < nc; i++)
                G[i] += product[i];
        }
        if (f->squares > 0)
            for (i = 0; i < nc; i++)
                gu[t * stride + i] = 2 * G[i];
        else rolni_tri_bwd(n, 2, 2, G, gu + t * stride);
    }
}

/* B += c Z_t S with S = E_t, E_0 = diag(e^l), E_t = K o F_t, where K is given, or S = F_t, F_0 = diag(l), where K is NULL.
   S and product [m][m] are scratch. Inline, so that nothing of it is left where base is 0. */
ROLNI_INLINE void rolni_add_base(int m, int t, roln_real c, const roln_real *Z, const roln_real *l, const roln_real *K,
                                 const roln_real *F, roln_real *B, roln_real *S, roln_real *product)
{
    int i, j;
    for (i = 0; i < m; i++)
        for (j = 0; j < m; j++) {
            const int at = i * m + j;
            if (t == 0) S[at] = i != j ? 0 : K ? K[at] : l[i];
            else S[at] = K ? K[at] * F[(t - 1) * m * m + at] : F[(t - 1) * m * m + at];
        }
    roln_mm(m, m, m, Z + t * m * m, S, product);
    for (i = 0; i < m * m; i++)
        B[i] += c * product[i];
}

/* Backward of exp_P in the eigenbasis: Z_t, the cotangents of X_t, become those of U and its directions, and these those of u.
   exp_{BPB^T}(B U B^T) = B exp_P(U) B^T makes g_P = sym((sum_t gX_t X_t - gU_t U_t) P^-1), which in the eigenbasis is
   R^T sym(sum_t gX_t E_t - gU_t F_t) R, where X_t = Q^T E_t Q, E_0 = diag(e^l), E_t = K o F_t, F_0 = diag(l).
   grad: 1 with gtheta. D lies where S and product do. */
#define ROLNI_EXP_BWD_MEM(X, S, grad) X(B, (grad) * S(base) * S(n) * S(n))
#define ROLNI_EXP_BWD_WORK(S, k, grad) \
    (0 ROLNI_EXP_BWD_MEM(ROLNI_SIZE, S, grad) + \
     ROLN_MAX(((k) > 0) * S(n) * S(n) * S(n), 2 * S(n) * S(n)))
ROLN_FN void rolni_exp_bwd(const roln_lnn *f, int k, const rolni_row *row, const roln_real *F, roln_real *Z, roln_real *gu,
                           int stride, roln_real *gtheta, roln_real *work)
{
    const rolni_tape *tape = row->tape;
    const int n = f->n, nn = n * n, base = f->base && gtheta; /* B is there with gtheta only */
    const roln_real *l = tape->l + row->r * n, *K = tape->K + row->r * nn, *R = tape->R + row->r * nn;
    int t, i;
    ROLNI_EXP_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, 1)
    roln_real *const D = work, *const S = work, *const product = S + nn;
    if (base) rolni_zero(nn, B);
    for (t = 0; base && t <= k; t++)
        rolni_add_base(n, t, 1, Z, l, K, F, B, S, product);
    if (k > 0) roln_exp_dd2(n, l, K, D);
    rolni_spectral_eig_bwd(n, k, K, D, F, Z);
    for (t = 0; t <= k; t++) {
        rolni_congr_t_set(n, R, Z + t * nn, S, product);
        rolni_tri_bwd(n, 1, 2, S, gu + t * stride);
        if (base) rolni_add_base(n, t, -1, Z, l, NULL, F, B, S, product);
    }
    if (!base) return;
    rolni_congr_t_set(n, R, B, S, product);
    rolni_twice_sym(n, S, B);
    for (i = 0; i < nn; i++)
        gtheta[rolni_base_at(f) + i] += B[i] / 2;
}

/* Backward of a row: of sum_t c_t p_t^T M_t q_t over the pairs t = 0 .. k. Writes the cotangents of u and of its directions to
   gu, one every `stride` numbers (over row->u, if they lie there), adds to those of the vectors of each pair and, for P and the
   layers, to gtheta (may be NULL). M of the row was formed before: rolni_form succeeds. */
#define ROLNI_ROW_BWD_MEM(X, S, k) X(F, (k) * S(n) * S(cols)) X(Z, (1 + (k)) * S(n) * S(n))
#define ROLNI_ROW_BWD_WORK(S, k, grad) \
    (0 ROLNI_ROW_BWD_MEM(ROLNI_SIZE, S, k) + \
     ROLN_MAX(ROLNI_CHAIN(S, k) + ROLN_MAX(ROLNI_LAYER_BWD_WORK(S, k), \
                                           ROLN_MAX(ROLNI_FORM_WORK(S, k), ROLNI_PAIRS_WORK(S, grad))), \
              ROLN_MAX(ROLNI_DIRECTIONS_WORK(S, k), \
                       S(cholesky) ? (1 + ((k) > 0)) * S(n) * S(cols) : ROLNI_EXP_BWD_WORK(S, k, grad))))
ROLN_FN void rolni_row_bwd(const roln_lnn *f, int k, const rolni_row *row, const rolni_pair *pair, roln_real *gu, int stride,
                           roln_real *gtheta, roln_real *work)
{
    const int n = f->n, nn = n * n, formed = rolni_formed(f), cols = rolni_columns(f);
    roln_real *M = NULL, *chain, *rest;
    int t;
    ROLNI_ROW_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, k)
    chain = rest = work;
    rolni_directions(f, k, row, F, work);
    if (formed) {
        rest += rolni_chain_size(f, k);
        (void)rolni_form(f, k, row, F, chain, &M, rest);
    }
    rolni_pairs_bwd(f, k, row, pair, M, F, Z, rest);
    if (formed) rolni_chain_bwd(f, k, row, chain, Z, gtheta, rest);
    if (f->mass == ROLN_CHOLESKY) {
        rolni_cholesky_bwd(f, k, row, F, Z, gu, stride, work);
        return;
    }
    for (t = 0; formed && t <= k; t++)
        roln_congr(n, row->tape->Q + row->r * nn, Z + t * nn, Z + t * nn, work);
    rolni_exp_bwd(f, k, row, F, Z, gu, stride, gtheta, work);
}

/* y = M x, from row r of a tape. x, y [n], work [n]. */
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

/* y = M^-1 x: R^T (e^-l o (R x)), or by the Cholesky factor of a formed M. x, y [n], work [n]. With driven coordinates, which are
   the last, M_ff is the block of the free ones, and the leading block of the factor is its factor: y_f = M_ff^-1 x_f, y_p = 0. */
ROLN_FN void rolni_minv(const roln_lnn *f, const rolni_tape *t, int r, const roln_real *x, roln_real *y, roln_real *work)
{
    const int n = f->n;
    if (rolni_formed(f)) {
        roln_solve_lower(n, t->C + r * n * n, x, work);
        rolni_zero(f->driven, work + n - f->driven);
        roln_solve_lower_t(n, t->C + r * n * n, work, y);
        return;
    }
    roln_spd_mul(n, t->el + r * n, t->R + r * n * n, x, y, work);
}

/* y = DM[direction] x for every row of a block, x, y [nb][n]; u [nb][outputs]: the direction in u. M was formed
   before: rolni_form succeeds. */
#define ROLNI_DM_MEM(X, S) X(F, S(n) * S(cols))
#define ROLNI_DM_WORK(S) \
    (0 ROLNI_DM_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLNI_DIRECTIONS_WORK(S, 1), S(formed) ? ROLNI_CHAIN(S, 1) + ROLNI_FORM_WORK(S, 1) \
                                                                                      : 2 * S(n)))
ROLN_FN void rolni_dm(const roln_lnn *f, int nb, const roln_real *theta, const rolni_tape *tape, const roln_real *u,
                      const roln_real *x, roln_real *y, roln_real *work)
{
    const int n = f->n, formed = rolni_formed(f), cols = rolni_columns(f);
    rolni_row row;
    int r;
    ROLNI_DM_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    row.theta = theta, row.tape = tape;
    for (r = 0; r < nb; r++) {
        row.r = r, row.u[0] = u + r * rolni_outputs(f);
        rolni_directions(f, 1, &row, F, work);
        if (formed) {
            roln_real *M;
            (void)rolni_form(f, 1, &row, F, work, &M, work + rolni_chain_size(f, 1));
            roln_mm_bt(1, n, n, x + r * n, M + n * n, y + r * n);
        } else {
            roln_mm_bt(1, n, n, x + r * n, tape->Q + r * n * n, work);
            rolni_from_basis(f, &row, 1, F, work, y + r * n, work + n);
        }
    }
}

/* ---- 4 mechanics ------------------------------------------------------------------------------ */

/* What the networks see of x on a tape: [1+dirs][nb][cossin] behind x, or without angles x itself. */
ROLNI_INLINE roln_real *rolni_net_input(const roln_lnn *f, int dirs, int nb, const rolni_tape *t)
{
    return f->angles ? t->x + (1 + dirs) * nb * f->n : t->x;
}

/* What the networks of a model with angles see of z [nb][n]: y [nb][cossin]. */
ROLNI_INLINE void rolni_see(const roln_lnn *f, int nb, const roln_real *z, roln_real *y)
{
    const int n = f->n, cossin = f->mass_net.size[0];
    int r, i, k;
    for (r = 0; r < nb; r++, z += n, y += cossin)
        for (i = 0, k = n; i < n; i++) {
            if (roln_lnn_angle(f, i)) roln_sincos(z[i], y + k, y + i), k++;
            else y[i] = z[i];
        }
}

/* Its derivative along x [nb][n]: y_t [nb][cossin], -sin z x and cos z x for an angle. */
ROLNI_INLINE void rolni_see_along(const roln_lnn *f, int nb, const roln_real *y, const roln_real *x, roln_real *y_t)
{
    const int n = f->n, cossin = f->mass_net.size[0];
    int r, i, k;
    for (r = 0; r < nb; r++, y += cossin, x += n, y_t += cossin)
        for (i = 0, k = n; i < n; i++) {
            y_t[i] = x[i];
            if (roln_lnn_angle(f, i)) y_t[i] = -y[k] * x[i], y_t[k] = y[i] * x[i], k++;
        }
}

/* Backward of both, of k directions: the cotangents gy [1+k][nb][cossin] of y and its y_t add to gx [1+k][nb][n], those of z and
   of the directions x_1, x_2 [nb][n]. */
ROLNI_INLINE void rolni_see_bwd(const roln_lnn *f, int k, int nb, const roln_real *y, const roln_real *const *x,
                                const roln_real *gy, roln_real *gx)
{
    const int n = f->n, cossin = f->mass_net.size[0];
    int r, i, j, t;
    for (r = 0; r < nb; r++)
        for (i = 0, j = n; i < n; i++) {
            const roln_real c = y[r * cossin + i], s = roln_lnn_angle(f, i) ? y[r * cossin + j] : 0;
            for (t = 0; t <= k; t++) {
                const roln_real *g = gy + (t * nb + r) * cossin;
                roln_real *to = gx + (t * nb + r) * n + i;
                if (!roln_lnn_angle(f, i)) {
                    *to += g[i];
                } else {
                    *to += c * g[j] - s * g[i];
                    if (t > 0) gx[r * n + i] -= x[t - 1][r * n + i] * (c * g[i] + s * g[j]);
                }
            }
            j += roln_lnn_angle(f, i);
        }
}

/* gz [nb][n] = the gradient by z of the potential network (potential 1) or of the mass network (0), whose outputs have the
   cotangents gy, on a tape with its slopes. second: the cotangents within stay, in place of the outputs of the value. */
#define ROLNI_BELOW_WORK(S, nb, hidden, back) ((nb) * S(cossin) + (nb) * S(hidden) + S(back))
ROLNI_INLINE void rolni_below(const roln_lnn *f, int potential, int dirs, int second, int nb, const roln_real *theta,
                              const rolni_tape *t, const roln_real *gy, roln_real *gz, roln_real *work)
{
    const roln_mlp *const net = potential ? &f->potential_net : &f->mass_net;
    roln_real *const g = f->angles ? work : gz, *ga = work + nb * rolni_cossin(f), *const more = ga + nb * roln_mlp_hidden(net);
    if (second) ga = potential ? t->potential_out : t->mass_out;
    roln_mlp_gradient(net, second && !potential ? 1 + dirs : 1, nb, theta + (potential ? rolni_potential_at(f) : 0),
                      potential ? t->potential_slope : t->mass_slope, gy, ga, g, more);
    if (!f->angles) return;
    rolni_zero(nb * f->n, gz);
    rolni_see_bwd(f, 0, nb, rolni_net_input(f, dirs, nb, t), NULL, g, gz);
}

/* How much is wanted of a sweep at s = [z; zd]. Each has what is above it, too. */
enum {
    ROLNI_MASS,     /* networks, mass matrix, d; with friction 2 the friction is missing in d */
    ROLNI_GRADIENT, /* kin, g */
    ROLNI_CORIOLIS, /* DM[zd] w */
    ROLNI_SECOND    /* with keep, what derivatives of second order need, in place of what a backward to theta needs (rolni_below) */
};
#define ROLNI_ALL_OF_D(friction) ((friction) > 1 ? ROLNI_GRADIENT : ROLNI_MASS) /* the least with all of d */

/* The networks at the inputs on the tape: v and, if wanted, g; L; u and its directions. Leaves the slopes of the mass network on
   the tape or, without keep, in the first nb planes_1 numbers of work, where t->mass_slope then points. */
#define ROLNI_NETWORKS_WORK(S, dirs, keep, wanted, nb) /* behind these */ \
    ROLN_MAX((1 - (keep)) * (nb) * ((wanted) < ROLNI_CORIOLIS ? S(planes_1) : (dirs) < 2 ? S(planes_2) : S(planes_3)), \
             (wanted) < ROLNI_GRADIENT ? 0 : (nb) + ROLNI_BELOW_WORK(S, nb, hidden_v, back_v))
ROLN_FN void rolni_networks(const roln_lnn *f, int dirs, int keep, int nb, const roln_real *theta, int wanted, rolni_tape *t,
                            roln_real *work)
{
    const int hidden = nb * rolni_hidden(f), planes = wanted < ROLNI_CORIOLIS ? 1 : 1 + dirs;
    const roln_real *potential = theta + rolni_potential_at(f), *y = rolni_net_input(f, dirs, nb, t);
    roln_real *rest = keep ? work : work + hidden;
    int r;
    if (!keep) {
        t->mass_slope = t->potential_slope = t->damper_slope = work;
        t->mass_out = t->potential_out = t->damper_out = rest;
    }
    roln_mlp_forward(&f->potential_net, 1, 1, nb, potential, y, t->v, t->potential_slope, t->potential_out);
    if (wanted >= ROLNI_GRADIENT) { /* g = dV/dz */
        for (r = 0; r < nb; r++)
            rest[r] = 1;
        rolni_below(f, 1, dirs, wanted == ROLNI_SECOND, nb, theta, t, rest, t->g, rest + nb);
    }
    if (f->damping)
        roln_mlp_forward(&f->damper_net, 1, 1, nb, theta + rolni_damper_at(f), y, t->L, t->damper_slope, t->damper_out);
    roln_mlp_forward(&f->mass_net, 1, planes, nb, theta, y, t->u, t->mass_slope, t->mass_out);
}

/* Eigenbasis of row r: Q, R, K, el and l [n] from u; A: Cholesky factor of P, if base. Status of roln_eig, roln_exp_range. */
#define ROLNI_EIGENBASIS_WORK(S) ROLN_MAX(ROLN_EIG_WORK(S(n)), S(base) * (S(n) * S(n) + S(n)))
ROLN_FN roln_status rolni_eigenbasis(const roln_lnn *f, const rolni_tape *t, int r, const roln_real *A, roln_real *l,
                                     roln_real *work)
{
    const int n = f->n, nn = n * n;
    roln_real *Q = t->Q + r * nn, *G = work, *column = G + nn;
    roln_status st;
    int i, j;
    rolni_sym(n, t->u + r * ROLN_TRI(n), Q);
    if (f->base) { /* A^-1 U A^-T */
        for (i = 0; i < n; i++)
            roln_solve_lower(n, A, Q + i * n, G + i * n);
        for (i = 0; i < n; i++) {
            for (j = 0; j < n; j++)
                column[j] = G[j * n + i];
            roln_solve_lower(n, A, column, Q + i * n);
        }
    }
    if ((st = roln_eig(n, Q, l, Q, work)) != ROLN_OK || (st = roln_exp_range(n, l)) != ROLN_OK) return st;
    if (f->base) { /* with the eigenvectors V: Q = V A^T, R = V A^-1 */
        roln_real *V = G;
        rolni_copy(nn, Q, V);
        roln_mm_bt(n, n, n, V, A, Q);
        for (i = 0; i < n; i++)
            roln_solve_lower_t(n, A, V + i * n, t->R + r * nn + i * n);
    }
    roln_exp_dd1(n, l, t->K + r * nn);
    for (i = 0; i < n && !rolni_formed(f); i++)
        t->el[r * n + i] = roln_exp(-l[i]);
    return ROLN_OK;
}

/* M and its Cholesky factor of a row, where M is formed. Status of rolni_form and roln_chol. */
#define ROLNI_FORM_MASS_WORK(S) (S(formed) * (ROLNI_CHAIN(S, 0) + ROLNI_FORM_WORK(S, 0)))
ROLN_FN roln_status rolni_form_mass(const roln_lnn *f, const rolni_row *row, roln_real *work)
{
    const int n = f->n;
    roln_real *M = row->tape->M + row->r * n * n, *last = NULL;
    const roln_status st = rolni_form(f, 0, row, NULL, work, &last, work + rolni_chain_size(f, 0));
    int i, j;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) /* symmetric to the bit */
        for (j = 0; j <= i; j++)
            M[i * n + j] = M[j * n + i] = last[i * n + j];
    return roln_chol(n, M, row->tape->C + row->r * n * n);
}

/* The outputs of the damper network in row r: the triangle of L, and W [n][n] of drag behind it. */
ROLN_FN const roln_real *rolni_damper_row(const roln_lnn *f, const rolni_tape *t, int r)
{
    return t->L + r * ROLNI_DAMPER(f->damping, f->n);
}

/* d = R zd = L (L^T zd) of row r, 0 without damping; with drag d += W (|y| o y), y = W^T zd. Each y takes the power |y|^3. */
#define ROLNI_DAMPING_WORK(S) ((S(damping) > 0) * (S(n) * S(n) + S(n)))
ROLN_FN void rolni_damping(const roln_lnn *f, const rolni_tape *t, int r, roln_real *work)
{
    const int n = f->n;
    roln_real *L = work, *y = L + n * n;
    if (!f->damping) {
        rolni_zero(n, t->d + r * n);
        return;
    }
    rolni_low(n, rolni_damper_row(f, t, r), L);
    roln_mm(1, n, n, t->zd + r * n, L, y);
    roln_mm_bt(1, n, n, y, L, t->d + r * n);
    if (f->damping > 1) {
        const roln_real *W = rolni_damper_row(f, t, r) + ROLN_TRI(n);
        roln_real *drag = work;
        int i;
        roln_mm(1, n, n, t->zd + r * n, W, y);
        for (i = 0; i < n; i++)
            y[i] *= ROLN_ABS(y[i]);
        roln_mm_bt(1, n, n, y, W, drag);
        for (i = 0; i < n; i++)
            t->d[r * n + i] += drag[i];
    }
}

/* The law of friction 2 at one coordinate, after measured servo drives (arXiv 2410.08650):
       d = (c (1 + a y) + s (1 - Y^2) + l |g|) y,   y = tanh(zd / v),  Y = tanh(zd / w),   c, v, s, w, l > 0,  -1 < a < 1
   c: level, larger in one direction with a; s: excess at rest (Stribeck), which falls over the velocity w; l: part of the static
   load |g|. Each term takes power at any zd, since every factor of y is at least 0. */
typedef struct {
    roln_real x, X, y, Y;     /* zd / v, zd / w and their tanh */
    roln_real c, a, s, l;     /* a, and the levels: c, s (1 - Y^2), l |g| */
    roln_real sign;           /* of g; 0 if g is 0 */
} rolni_law;

/* The law of coordinate i from its numbers law [6][n]. */
ROLN_FN rolni_law rolni_law_of(int n, int i, const roln_real *law, roln_real zd, roln_real g)
{
    rolni_law o;
    o.x = roln_exp(-law[n + i]) * zd, o.y = roln_tanh(o.x);
    o.X = roln_exp(-law[3 * n + i]) * zd, o.Y = roln_tanh(o.X);
    o.c = roln_exp(law[i]), o.a = roln_tanh(law[5 * n + i]);
    o.s = roln_exp(law[2 * n + i]) * ((1 - o.Y) * (1 + o.Y));
    o.l = roln_exp(law[4 * n + i]) * ROLN_ABS(g);
    o.sign = ROLNI_AS(roln_real, (g > 0) - (g < 0));
    return o;
}

/* Dry friction of row r: d += c o tanh(zd / v), or by rolni_law, which reads g of the tape. law: numbers of friction. */
ROLN_FN void rolni_friction(const roln_lnn *f, const roln_real *law, const rolni_tape *t, int r)
{
    const int n = f->n;
    int i;
    for (i = 0; i < n; i++) {
        const int at = r * n + i;
        if (f->friction > 1) {
            const rolni_law o = rolni_law_of(n, i, law, t->zd[at], t->g[at]);
            t->d[at] += (o.c * (1 + o.a * o.y) + o.s + o.l) * o.y;
        } else {
            t->d[at] += roln_exp(law[i]) * roln_tanh(roln_exp(-law[n + i]) * t->zd[at]);
        }
    }
}

/* With friction 2 the potential acts by g and by the load in d, a^T dd = sum_i a_i l_i y_i sgn(g_i) dg_i. So the cotangent a of g,
   row r of a block, becomes that of both, to_i = a_i (1 + l_i y_i sgn g_i). to [n] may be a. */
ROLN_FN void rolni_load_bwd(int n, const roln_real *law, const rolni_tape *t, int r, const roln_real *a, roln_real *to)
{
    int i;
    for (i = 0; i < n; i++) {
        const rolni_law o = rolni_law_of(n, i, law, t->zd[r * n + i], t->g[r * n + i]);
        to[i] = a[i] * (1 + roln_exp(law[4 * n + i]) * o.y * o.sign);
    }
}

/* One sweep forward: fills the tape at s [2][nb][n]. w [nb][n]: the velocity of roln_lnn_inverse, NULL for zd. The gradient
   kin = 1/2 grad_z (zd^T M w) is the backward of a row at once, rolni_row_bwd, with the pair (zd, w) and no directions; its
   cotangents of u take the place of u, which the eigenbasis has used by then. */
#define ROLNI_EVAL_MEM(X, S, keep) \
    X(A, S(base) * S(n) * S(n)) X(l_row, (1 - (keep)) * (1 - S(cholesky)) * S(n))
#define ROLNI_MASS_ROW_WORK(S) \
    ROLN_MAX(ROLN_MAX(S(cholesky) ? 0 : ROLNI_EIGENBASIS_WORK(S), ROLNI_FORM_MASS_WORK(S)), ROLNI_DAMPING_WORK(S))
#define ROLNI_MASS_ONLY_WORK(S) (0 ROLNI_EVAL_MEM(ROLNI_SIZE, S, 0) + S(row_mass)) /* with keep 0 */
#define ROLNI_GRADIENT_ROW_WORK(S, keep) (0 ROLNI_EVAL_MEM(ROLNI_SIZE, S, keep) + ROLN_MAX(S(row_mass), S(row_bwd)))
#define ROLNI_ALL_ROW_WORK(S, keep) ROLN_MAX((keep) ? S(row_gradient_1) : S(row_gradient_0), S(row_dm))
#define ROLNI_EVAL_ROW(S, keep, wanted) \
    ((wanted) < ROLNI_GRADIENT   ? S(row_mass_0) \
     : (wanted) < ROLNI_CORIOLIS ? (keep) ? S(row_gradient_1) : S(row_gradient_0) \
     : (keep)                    ? S(row_all_1) \
                                 : S(row_all_0))
#define ROLNI_EVAL_WORK(S, dirs, keep, wanted, nb) \
    ((1 - (keep)) * (nb) * S(planes_1) + \
     ROLN_MAX(ROLNI_NETWORKS_WORK(S, dirs, keep, wanted, nb), \
              ROLN_MAX(ROLNI_EVAL_ROW(S, keep, wanted), (wanted) < ROLNI_GRADIENT ? 0 : ROLNI_BELOW_WORK(S, nb, hidden, back))))
ROLN_FN roln_status rolni_eval(const roln_lnn *f, int keep, int nb, const roln_real *theta, const roln_real *s, const roln_real *w,
                               int wanted, roln_real *tape, roln_real *work)
{
    const int n = f->n, base = f->base, cholesky = f->mass == ROLN_CHOLESKY, outputs = rolni_outputs(f);
    const int dirs = w ? 2 : 1;
    rolni_tape t = rolni_tape_of(f, dirs, keep, nb, tape);
    roln_real *rest, *y = rolni_net_input(f, dirs, nb, &t);
    rolni_pair pair;
    rolni_row row;
    roln_status st;
    int r;
    if (!roln_all_finite(2 * nb * n, s)) return ROLN_E_NOT_FINITE;
    rolni_copy(nb * n, s, t.x);
    rolni_copy(nb * n, s + nb * n, t.zd);
    if (w) rolni_copy(nb * n, w, t.x + nb * n);
    if (f->angles) {
        rolni_see(f, nb, t.x, y);
        if (!roln_all_finite(nb * rolni_cossin(f), y)) return ROLN_E_NOT_FINITE;
    }
    for (r = 1; f->angles && wanted >= ROLNI_CORIOLIS && r <= dirs; r++)
        rolni_see_along(f, nb, y, t.x + r * nb * n, y + r * nb * rolni_cossin(f));
    rolni_networks(f, dirs, keep, nb, theta, wanted, &t, work);
    work += keep ? 0 : nb * rolni_hidden(f);
    rest = work;
    {
        ROLNI_EVAL_MEM(ROLNI_CARVE, ROLNI_LOCAL, keep)
        if (base && (st = roln_chol(n, theta + rolni_base_at(f), A)) != ROLN_OK) return st;
        pair.c = ROLN_C(0.5), pair.p = t.zd, pair.q = w ? t.x + nb * n : t.zd, pair.gp = pair.gq = NULL;
        row.theta = theta, row.tape = &t;
        for (r = 0; r < nb; r++) {
            row.r = r;
            if (cholesky) rolni_of_u(f, t.u + r * outputs, t.Q + r * n * rolni_columns(f));
            else if ((st = rolni_eigenbasis(f, &t, r, A, keep ? t.l + r * n : l_row, work)) != ROLN_OK) return st;
            if (rolni_formed(f) && (st = rolni_form_mass(f, &row, work)) != ROLN_OK) return st;
            if (wanted >= ROLNI_GRADIENT) rolni_row_bwd(f, 0, &row, &pair, t.u + r * outputs, 0, NULL, work);
            rolni_damping(f, &t, r, work);
            if (f->friction > 0 && wanted >= ROLNI_ALL_OF_D(f->friction)) rolni_friction(f, theta + rolni_friction_at(f), &t, r);
        }
    }
    if (wanted < ROLNI_GRADIENT) return ROLN_OK;
    if (wanted >= ROLNI_CORIOLIS) rolni_dm(f, nb, theta, &t, t.u + dirs * nb * outputs, pair.q, t.dmv, rest);
    rolni_below(f, 0, dirs, wanted == ROLNI_SECOND, nb, theta, &t, t.u, t.kin, rest);
    return ROLN_OK;
}

/* The scalar whose gradient all backward passes need, on a tape filled at (z, zd):

       S = sum_t c_t p_t^T (D^t M) q_t - a^T g - a^T d      t = 0: M; t = 1: DM[a]; t = 2: DM[zd]

   k: the last t; a [nb][n], NULL with k = 0: no a, and no terms in g and d. */
typedef struct {
    int k;
    const roln_real *a;
    rolni_pair pair[3];
} rolni_scalar;

/* -a^T d = -(L^T a)^T (L^T zd) and, with drag, -x^T (|y| o y), x = W^T a, y = W^T zd, so that
       g_W = -(a (|y| o y)^T + zd (2 |y| o x)^T),   g_zd = -W (2 |y| o x) .
   Adds to gy [nb][inputs of the networks], gzd [nb][n] and gtheta. */
#define ROLNI_DAMPING_BWD_MEM(X, S, nb) X(gL, (nb) * S(damper))
#define ROLNI_DAMPING_BWD_WORK(S, nb) \
    (0 ROLNI_DAMPING_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(2 * S(n) * S(n) + 2 * S(n), ROLN_MLP_BWD_WORK(1, nb, S(wide)) + S(back)))
ROLN_FN void rolni_damping_bwd(const roln_lnn *f, int nb, const roln_real *theta, const rolni_tape *t, const roln_real *a,
                               roln_real *gy, roln_real *gzd, roln_real *gtheta, roln_real *work)
{
    const int n = f->n, at = rolni_damper_at(f), damper = ROLNI_DAMPER(f->damping, n);
    roln_mlp_plane plane;
    int r, i;
    ROLNI_DAMPING_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    for (r = 0; r < nb; r++) {
        const roln_real *ar = a + r * n, *vr = t->zd + r * n, *out = rolni_damper_row(f, t, r), *W = out + ROLN_TRI(n);
        roln_real *L = work, *G = L + n * n, *x = G + n * n, *y = x + n, *gout = gL + r * damper;
        rolni_low(n, out, L);
        roln_mm(1, n, n, ar, L, x);
        roln_mm(1, n, n, vr, L, y);
        for (i = 0; i < n * n; i++)
            G[i] = ar[i / n] * y[i % n] + vr[i / n] * x[i % n];
        rolni_tri_bwd(n, -1, -1, G, gout);
        roln_mm_bt(1, n, n, x, L, y);
        for (i = 0; i < n; i++)
            gzd[r * n + i] -= y[i];
        if (f->damping == 1) continue;
        roln_mm(1, n, n, ar, W, x);
        roln_mm(1, n, n, vr, W, y);
        for (i = 0; i < n; i++) {
            x[i] *= 2 * ROLN_ABS(y[i]);
            y[i] *= ROLN_ABS(y[i]);
        }
        for (i = 0; i < n * n; i++)
            gout[ROLN_TRI(n) + i] = -(ar[i / n] * y[i % n] + vr[i / n] * x[i % n]);
        roln_mm_bt(1, n, n, x, W, y);
        for (i = 0; i < n; i++)
            gzd[r * n + i] -= y[i];
    }
    plane.x = rolni_net_input(f, 1, nb, t), plane.out = t->damper_out, plane.planes = 1, plane.at = 0;
    roln_mlp_bwd(&f->damper_net, 1, nb, theta + at, &plane, t->damper_slope, gL, gy, gtheta ? gtheta + at : NULL, work);
}

/* -a^T (c o tanh(zd / v)), or by rolni_law at fixed g: adds to gzd [nb][n] and to glaw, the cotangents of the numbers of friction
   (may be NULL). */
ROLN_FN void rolni_friction_bwd(const roln_lnn *f, int nb, const roln_real *law, const rolni_tape *t, const roln_real *a,
                                roln_real *gzd, roln_real *glaw)
{
    const int n = f->n;
    int r, i;
    for (r = 0; r < nb; r++)
        for (i = 0; i < n; i++) {
            const roln_real u = roln_exp(-law[n + i]), ar = a[r * n + i];
            if (f->friction > 1) {
                const rolni_law o = rolni_law_of(n, i, law, t->zd[r * n + i], t->g[r * n + i]);
                const roln_real slope = ar * (o.c * (1 + 2 * o.a * o.y) + o.s + o.l) * ((1 - o.y) * (1 + o.y));
                const roln_real fall = 2 * ar * o.s * o.y * o.Y;
                gzd[r * n + i] -= slope * u - fall * roln_exp(-law[3 * n + i]);
                if (!glaw) continue;
                glaw[i] -= ar * o.c * (1 + o.a * o.y) * o.y, glaw[n + i] += slope * o.x;
                glaw[2 * n + i] -= ar * o.s * o.y, glaw[3 * n + i] -= fall * o.X;
                glaw[4 * n + i] -= ar * o.l * o.y, glaw[5 * n + i] -= ar * o.c * ((1 - o.a) * (1 + o.a)) * o.y * o.y;
            } else {
                const roln_real x = u * t->zd[r * n + i], y = roln_tanh(x);
                const roln_real ac = ar * roln_exp(law[i]), slope = ac * ((1 - y) * (1 + y));
                gzd[r * n + i] -= slope * u;
                if (glaw) glaw[i] -= ac * y, glaw[n + i] += slope * x;
            }
        }
}

/* -a^T g = -DV[a]: adds to gy [2][nb][inputs], the cotangents of what the network sees of z and of a, given as a, and to gtheta. */
#define ROLNI_POTENTIAL_BWD_MEM(X, S, nb) X(gv, 2 * (nb)) X(out, (nb) * S(hidden_v))
#define ROLNI_POTENTIAL_BWD_WORK(S, nb) \
    (0 ROLNI_POTENTIAL_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_MLP_BWD_WORK(2, nb, S(wide_v)) + 2 * S(back_v))
ROLN_FN void rolni_potential_bwd(const roln_lnn *f, int nb, const roln_real *theta, const rolni_tape *t, const roln_real *a,
                                 roln_real *gy, roln_real *gtheta, roln_real *work)
{
    const int hidden_v = roln_mlp_hidden(&f->potential_net), at = rolni_potential_at(f);
    roln_mlp_plane plane[2];
    int i;
    ROLNI_POTENTIAL_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    roln_mlp_forward(&f->potential_net, 0, 1, nb, theta + at, a, gv, t->potential_slope, out);
    for (i = 0; i < 2 * nb; i++) /* DV[a] itself is not needed */
        gv[i] = i < nb ? 0 : -1;
    plane[0].x = rolni_net_input(f, 1, nb, t), plane[0].out = t->potential_out, plane[1].x = a, plane[1].out = out;
    plane[0].planes = plane[1].planes = 1, plane[0].at = plane[1].at = 0;
    roln_mlp_bwd(&f->potential_net, 2, nb, theta + at, plane, t->potential_slope, gv, gy, gtheta ? gtheta + at : NULL, work);
}

/* The terms in M: adds to gy [1+k][nb][inputs], the cotangents of what the network sees of z, of a, which is given as a, and of zd,
   to those of the vectors of the pairs and to gtheta. */
#define ROLNI_MASS_BWD_MEM(X, S, k, nb) X(gu, (1 + (k)) * (nb) * S(outputs)) X(out, ((k) > 0) * (nb) * S(hidden))
#define ROLNI_MASS_BWD_WORK(S, k, nb) \
    (0 ROLNI_MASS_BWD_MEM(ROLNI_SIZE, S, k, nb) + \
     ROLN_MAX((k) > 1 ? S(row_bwd_2) : (k) > 0 ? S(row_bwd_1) : S(row_bwd_0), \
              ROLN_MLP_BWD_WORK(1 + (k), nb, S(wide)) + ((k) ? 2 : 1) * S(back)))
ROLN_FN void rolni_mass_bwd(const roln_lnn *f, int nb, const roln_real *theta, const rolni_tape *t, const rolni_scalar *of,
                            const roln_real *a, roln_real *gy, roln_real *gtheta, roln_real *work)
{
    const int k = of->k, hidden = roln_mlp_hidden(&f->mass_net), outputs = rolni_outputs(f), stride = nb * outputs;
    const roln_real *y = rolni_net_input(f, 1, nb, t);
    roln_mlp_plane plane[3];
    rolni_row row;
    int r, p;
    ROLNI_MASS_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, k, nb)
    if (k > 0) roln_mlp_forward(&f->mass_net, 0, 1, nb, theta, a, gu + stride, t->mass_slope, out); /* u along a */
    row.theta = theta, row.tape = t;
    for (r = 0; r < nb; r++) {
        row.r = r, row.u[0] = gu + stride + r * outputs, row.u[1] = t->u + stride + r * outputs;
        rolni_row_bwd(f, k, &row, of->pair, gu + r * outputs, stride, gtheta, work);
    }
    for (p = 0; p <= k; p++) { /* z and zd from one call where zd was wanted */
        plane[p].x = p == 0 ? y : p == 1 ? a : y + nb * f->mass_net.size[0];
        plane[p].out = p == 1 ? out : t->mass_out;
        plane[p].planes = p != 1 && k == 2 ? 2 : 1;
        plane[p].at = p == 2;
    }
    roln_mlp_bwd(&f->mass_net, 1 + k, nb, theta, plane, t->mass_slope, gu, gy, gtheta, work);
}

/* One sweep back: the gradient of S. Adds to gz, gzd [nb][n], beside what the pairs add, and to gtheta, where weights of inputs
   that a network does not see get 0. Each may be NULL, but gzd with k = 1. Tape with keep, filled with ROLNI_CORIOLIS for k = 2,
   with less for k = 0, 1. */
#define ROLNI_ADJOINT_MEM(X, S, k, nb) \
    X(gx, (1 + (k)) * (nb) * S(n)) X(gy, (1 + (k)) * (nb) * S(cossin)) X(ya, ((k) > 0) * (nb) * S(cossin)) \
    X(load, ((k) > 0) * (S(friction) > 1) * (nb) * S(n))
#define ROLNI_ADJOINT_WORK(S, k, nb) \
    (0 ROLNI_ADJOINT_MEM(ROLNI_SIZE, S, k, nb) + \
     ROLN_MAX(ROLNI_MASS_BWD_WORK(S, k, nb), ((k) > 0) * ROLN_MAX(ROLNI_POTENTIAL_BWD_WORK(S, nb), \
                                                                  (S(damping) > 0) * ROLNI_DAMPING_BWD_WORK(S, nb))))
ROLN_FN void rolni_adjoint(const roln_lnn *f, int nb, const roln_real *theta, const rolni_scalar *of, roln_real *gz, roln_real *gzd,
                           roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const int n = f->n, k = of->k, cossin = rolni_cossin(f), friction = f->friction;
    const rolni_tape t = rolni_tape_of(f, 1, 1, nb, tape);
    const roln_real *along[2] = {of->a, t.zd}, *a = of->a, *const law = theta + rolni_friction_at(f);
    roln_real *g;
    int i;
    ROLNI_ADJOINT_MEM(ROLNI_CARVE, ROLNI_LOCAL, k, nb)
    rolni_zero((1 + k) * nb * n, gx);
    g = f->angles ? gy : gx;
    if (f->angles) rolni_zero((1 + k) * nb * cossin, gy);
    if (f->angles && k > 0) rolni_see_along(f, nb, rolni_net_input(f, 1, nb, &t), of->a, ya), a = ya;
    rolni_mass_bwd(f, nb, theta, &t, of, a, g, gtheta, work);
    if (k > 0 && friction > 1) { /* from here on a is the cotangent of g, which is another than that of the mass */
        for (i = 0; i < nb; i++)
            rolni_load_bwd(n, law, &t, i, of->a + i * n, load + i * n);
        if (f->angles) {
            rolni_see_bwd(f, k, nb, rolni_net_input(f, 1, nb, &t), along, gy, gx);
            rolni_zero((1 + k) * nb * cossin, gy);
            rolni_see_along(f, nb, rolni_net_input(f, 1, nb, &t), load, ya);
        }
        along[0] = load, a = f->angles ? ya : load;
    }
    if (k > 0) rolni_potential_bwd(f, nb, theta, &t, a, g, gtheta, work);
    if (k > 0 && f->damping) rolni_damping_bwd(f, nb, theta, &t, of->a, g, k == 2 ? gx + 2 * nb * n : gzd, gtheta, work);
    if (k > 0 && f->friction > 0)
        rolni_friction_bwd(f, nb, law, &t, of->a, k == 2 ? gx + 2 * nb * n : gzd, gtheta ? gtheta + rolni_friction_at(f) : NULL);
    if (f->angles) rolni_see_bwd(f, k, nb, rolni_net_input(f, 1, nb, &t), along, gy, gx);
    if (gtheta) {
        rolni_unseen_bwd(&f->mass_net, theta, gtheta);
        if (k > 0) rolni_unseen_bwd(&f->potential_net, theta + rolni_potential_at(f), gtheta + rolni_potential_at(f));
        if (k > 0 && f->damping) rolni_unseen_bwd(&f->damper_net, theta + rolni_damper_at(f), gtheta + rolni_damper_at(f));
    }
    for (i = 0; gz && i < nb * n; i++)
        gz[i] += gx[i];
    for (i = 0; gzd && k == 2 && i < nb * n; i++)
        gzd[i] += gx[2 * nb * n + i];
}

/* With driven coordinates: rhs [n] of row r -= M zdd_p, and zdd of the tape becomes [0; a], a = tau_z of the driven ones, NULL: 0.
   work [n]. */
ROLN_FN void rolni_prescribe(const roln_lnn *f, const rolni_tape *t, int r, const roln_real *tau_z, roln_real *rhs,
                             roln_real *work)
{
    const int n = f->n, from = n - f->driven;
    roln_real *const zdd = t->zdd + r * n;
    int i;
    for (i = 0; i < n; i++)
        zdd[i] = i >= from && tau_z ? tau_z[r * n + i] : 0;
    rolni_mul(f, t, r, zdd, work, NULL);
    for (i = 0; i < from; i++)
        rhs[i] -= work[i];
}

/* Forward dynamics zdd = M^-1 (tau_z - c - g - d). With driven coordinates p, free ones f: tau_z of p is their acceleration,
       zdd_p = tau_z,p,   M_ff zdd_f = (tau_z - c - g - d)_f - M_fp zdd_p.
   theta, s [2][nb][n], tau_z [nb][n] (NULL: 0) in; zdd [nb][n] and the tape out. keep: 1 if roln_lnn_zdd_bwd is to follow, 2 if
   roln_lnn_zdd_jac, else 0; in sizes 2 counts as 1.
   tape [ROLN_LNN_TAPE(S, 1, keep, nb)]. Status of roln_eig, roln_exp_range and roln_chol (P, a formed M), ROLN_E_NOT_FINITE; zdd is
   written only on ROLN_OK. */
#define ROLN_LNN_ZDD_WORK(S, keep, nb) ROLNI_EVAL_WORK(S, 1, keep, ROLNI_CORIOLIS, nb) /* 2 n and more */
ROLN_FN roln_status roln_lnn_zdd(const roln_lnn *f, int keep, int nb, const roln_real *theta, const roln_real *s,
                                 const roln_real *tau_z, roln_real *zdd, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, 1, keep > 0, nb, tape);
    const roln_status st = rolni_eval(f, keep > 0, nb, theta, s, NULL, keep > 1 ? ROLNI_SECOND : ROLNI_CORIOLIS, tape, work);
    int r, i;
    if (st != ROLN_OK) return st;
    for (r = 0; r < nb; r++) {
        roln_real *rhs = work;
        for (i = r * n; i < r * n + n; i++)
            rhs[i - r * n] = (tau_z ? tau_z[i] : 0) - (t.dmv[i] - t.kin[i]) - t.g[i] - t.d[i];
        if (f->driven > 0) rolni_prescribe(f, &t, r, tau_z, rhs, work + n);
        rolni_minv(f, &t, r, rhs, t.zdd + r * n, work + n);
        for (i = n - f->driven; i < n; i++)
            t.zdd[r * n + i] = tau_z ? tau_z[r * n + i] : 0;
    }
    if (!roln_all_finite(nb * n, t.zdd)) return ROLN_E_NOT_FINITE;
    rolni_copy(nb * n, t.zdd, zdd);
    return ROLN_OK;
}

/* Backward of -lambda^T (M zdd + c + g + d) at fixed lambda [nb][n], zdd being that of the tape: adds to gs [2][nb][n],
   gzdd [nb][n] and gtheta (each may be NULL). Both dynamics go back by it. */
ROLN_FN void rolni_motion_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_real *lambda, roln_real *gs,
                              roln_real *gzdd, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const rolni_tape t = rolni_tape_of(f, 1, 1, nb, tape);
    roln_real *gzd = gs ? gs + nb * f->n : NULL;
    rolni_scalar of;
    const rolni_pair inertia = {-1, lambda, t.zdd, NULL, gzdd};
    const rolni_pair kinetic = {ROLN_C(0.5), t.zd, t.zd, gzd, gzd}, along_zd = {-1, lambda, t.zd, NULL, gzd};
    of.k = 2, of.a = lambda, of.pair[0] = inertia, of.pair[1] = kinetic, of.pair[2] = along_zd;
    rolni_adjoint(f, nb, theta, &of, gs, gzd, gtheta, tape, work);
}

/* Backward of roln_lnn_zdd on its tape with cotangent y [nb][n] of zdd: lambda = M^-1 y is the cotangent of tau_z, and
   -lambda^T (M zdd + c + g + d) at fixed lambda, zdd gives the rest. With driven coordinates lambda_p = 0, and (y - M lambda)_p is
   the cotangent of their accelerations. Adds to gs [2][nb][n], gtau_z [nb][n] and gtheta (each may be NULL). */
#define ROLN_LNN_ZDD_BWD_MEM(X, S, nb) X(lambda, (nb) * S(n))
#define ROLN_LNN_ZDD_BWD_WORK(S, nb) (0 ROLN_LNN_ZDD_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(ROLNI_ADJOINT_WORK(S, 2, nb), S(n)))
ROLN_FN void roln_lnn_zdd_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_real *y, roln_real *gs,
                              roln_real *gtau_z, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, 1, 1, nb, tape);
    int r, i;
    ROLN_LNN_ZDD_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    for (r = 0; r < nb; r++)
        rolni_minv(f, &t, r, y + r * n, lambda + r * n, work);
    for (i = 0; gtau_z && i < nb * n; i++)
        gtau_z[i] += lambda[i];
    for (r = 0; gtau_z && f->driven > 0 && r < nb; r++) {
        rolni_mul(f, &t, r, lambda + r * n, work, NULL);
        for (i = n - f->driven; i < n; i++)
            gtau_z[r * n + i] += y[r * n + i] - work[i];
    }
    rolni_motion_bwd(f, nb, theta, lambda, gs, NULL, gtheta, tape, work);
}

/* Derivatives of one state, nb = 1, are rows: row j of D [2n][n] by number j of s = [z; zd]. They take n directions of z through
   the networks at once, and n rows back through the mass matrix alone.

   The directions as the networks see them, x [n][inputs], without angles unit vectors; with k = 2 behind them those of second
   order, along zd and each of them. */
#define ROLNI_NET_INPUTS(S) ROLN_MAX(S(n), S(cossin))
ROLN_FN void rolni_see_all(const roln_lnn *f, int k, const rolni_tape *t, roln_real *x)
{
    const int n = f->n, in = f->mass_net.size[0];
    const roln_real *y = rolni_net_input(f, 1, 1, t);
    int i, j = n;
    rolni_zero(k * n * in, x);
    for (i = 0; i < n; i++) {
        roln_real *e = x + i * in, *ev = e + n * in;
        if (!roln_lnn_angle(f, i)) {
            e[i] = 1;
            continue;
        }
        e[i] = -y[j], e[j] = y[i];
        if (k > 1) ev[i] = -y[i] * t->zd[i], ev[j] = -y[j] * t->zd[i];
        j++;
    }
}

/* Adds to H [n][n] the second derivatives by z of gy^T y, y the potential (gy = 1) or the outputs of the mass network (gy those of
   kin, fixed), on a tape filled with ROLNI_SECOND. u: derivatives of the outputs along x, [k][n][out], NULL: not wanted. */
#define ROLNI_CURVATURE_WORK(S, k) \
    (S(polynomials) ? ROLN_MAX(ROLN_POLYNOMIALS_HESSIAN_WORK(k, ROLNI_NET_INPUTS(S), S(hidden)), \
                               ROLN_POLYNOMIALS_HESSIAN_WORK(1, ROLNI_NET_INPUTS(S), S(hidden_v))) \
                    : ROLN_MLP_HESSIAN_WORK((k) * S(n), S(n), S(wide)))
ROLN_FN void rolni_curvature(const roln_lnn *f, int potential, int k, const roln_real *theta, const rolni_tape *t,
                             const roln_real *x, roln_real *u, roln_real *H, roln_real *work)
{
    const roln_mlp *const net = potential ? &f->potential_net : &f->mass_net;
    const roln_real *W = theta + (potential ? rolni_potential_at(f) : 0), *y = rolni_net_input(f, 1, 1, t);
    const roln_mlp_plane ga = {NULL, potential ? t->potential_out : t->mass_out, potential ? 1 : 2, 0};
    const roln_mlp_plane along = {NULL, t->mass_out, 2, 1};
    const int n = f->n, h = net->size[1];
    roln_real *const g = work;
    int i, j = n;
    roln_mlp_hessian(net, n, W, potential ? t->potential_slope : t->mass_slope, &ga, k > 1 ? &along : NULL, x, u, H, work);
    if (net->degree > 0 && f->angles) { /* g: the cotangents of what it sees */
        rolni_zero(net->size[0], g);
        rolni_mlp_polynomials_bwd(net, potential ? t->potential_slope : t->mass_slope, ga.out, NULL, NULL, g, NULL,
                                  g + net->size[0]);
    }
    for (i = 0; f->angles && i < n; i++) { /* cos'' = -cos, sin'' = -sin */
        if (!roln_lnn_angle(f, i)) continue;
        H[i * (n + 1)] -= net->degree > 0 ? y[i] * g[i] + y[j] * g[j]
                                          : y[i] * roln_dot(h, ga.out, W + i * h) + y[j] * roln_dot(h, ga.out, W + j * h);
        j++;
    }
}

/* What the mass matrix has in the derivatives of the equations of motion, V [3][n][n] and, added to H, the part of the second
   derivatives of T = 1/2 zd^T M zd at fixed zd that the second derivatives of u have not:
       row j of V_0: M_j zd,   with k = 2 row j of V_1: M_j zdd + M_vj zd, and V_2 = M_v,   H_ij += 1/2 zd^T D^2 M[U_i, U_j] zd
   with M_j, M_v the derivatives along e_j and along v = zd, M_vj the second one along both; u [k][n][outputs]: u_j, u_vj.
   M = L L^T + floor I: by the product rule, H_ij = (L_i^T zd)^T (L_j^T zd). */
#define ROLNI_CHOLESKY_JAC_MEM(X, n, cols) \
    X(b, (n) * (cols)) X(Lv, (n) * (cols)) X(Lj, (n) * (cols)) X(Lvj, (n) * (cols)) X(a, 6 * (cols))
#define ROLNI_CHOLESKY_JAC_WORK(n, cols) (0 ROLNI_CHOLESKY_JAC_MEM(ROLNI_SIZE, n, cols))
ROLN_FN void rolni_cholesky_jac(const roln_lnn *f, int k, const rolni_tape *t, const roln_real *u, roln_real *V, roln_real *H,
                                roln_real *work)
{
    const int n = f->n, nn = n * n, outputs = rolni_outputs(f), cols = rolni_columns(f);
    const roln_real *L = t->Q;
    int i, j;
    ROLNI_CHOLESKY_JAC_MEM(ROLNI_CARVE, n, cols)
    roln_real *const c = a + cols, *const aj = c + cols, *const cj = aj + cols, *const x = cj + cols, *const y = x + cols;
    roln_mm(1, n, cols, t->zd, L, c); /* L^T zd */
    if (k > 1) {                      /* a = L^T zdd + L_v^T zd */
        rolni_of_u(f, t->u + outputs, Lv);
        roln_mm(1, n, cols, t->zdd, L, a);
        roln_mm(1, n, cols, t->zd, Lv, x);
        for (i = 0; i < cols; i++)
            a[i] += x[i];
        roln_mm_bt(n, cols, n, Lv, L, Lj);
        rolni_twice_sym(n, Lj, V + 2 * nn);
    }
    for (j = 0; j < n; j++) {
        roln_real *const bj = b + j * cols;
        rolni_of_u(f, u + j * outputs, Lj);
        roln_mm(1, n, cols, t->zd, Lj, bj);
        roln_mm_bt(1, cols, n, c, Lj, x);
        roln_mm_bt(1, cols, n, bj, L, y);
        for (i = 0; i < n; i++)
            V[j * n + i] = x[i] + y[i];
        roln_mm_bt(1, cols, j + 1, bj, b, x);
        for (i = 0; i <= j; i++) {
            H[j * n + i] += x[i];
            if (i < j) H[i * n + j] += x[i];
        }
        if (k == 1) continue;
        rolni_of_u(f, u + (n + j) * outputs, Lvj);
        roln_mm(1, n, cols, t->zdd, Lj, aj);
        roln_mm(1, n, cols, t->zd, Lvj, cj);
        for (i = 0; i < cols; i++)
            aj[i] += cj[i];
        roln_mm_bt(1, cols, n, a, Lj, x);
        roln_mm_bt(1, cols, n, aj, L, y);
        roln_mm_bt(1, cols, n, c, Lvj, cj);
        roln_mm_bt(1, cols, n, bj, Lv, aj);
        for (i = 0; i < n; i++)
            V[nn + j * n + i] = (x[i] + y[i]) + (cj[i] + aj[i]);
    }
}

/* The linear map u -> (K o (R U R^T)) x, rows [n][tri]: row a is that of sum_cd U_cd R_ac w_ad, w = (K o x) R. work [2 n n]. */
ROLN_FN void rolni_exp_rows(int n, const roln_real *R, const roln_real *K, const roln_real *x, roln_real *rows, roln_real *work)
{
    roln_real *const w = work + n * n;
    int i;
    for (i = 0; i < n * n; i++)
        work[i] = K[i] * x[i % n];
    roln_mm(n, n, n, work, R, w);
    for (i = 0; i < n; i++) {
        rolni_outer(n, 1, R + i * n, w + i * n, work);
        rolni_tri_bwd(n, 1, 2, work, rows + i * ROLN_TRI(n));
    }
}

/* F_j = R U_j R^T, j < m, F [m][n][n], of the u [n][tri] and v [tri], the last if m > n. One product with R for all. work
   [m n n]. */
ROLN_FN void rolni_exp_directions(int n, int m, const roln_real *R, const roln_real *u, const roln_real *v, roln_real *F,
                                  roln_real *work)
{
    const int nn = n * n, tri = ROLN_TRI(n);
    int i, j, k;
    for (j = 0; j < m; j++) { /* U_j beside each other, [n][m][n] */
        rolni_sym(n, j < n ? u + j * tri : v, work);
        for (i = 0; i < n; i++)
            rolni_copy(n, work + i * n, F + (i * m + j) * n);
    }
    roln_mm(n, n, m * n, R, F, work);
    for (j = 0; j < m; j++)
        for (i = 0; i < n; i++) {
            roln_real *const row = F + j * nn + i * n;
            roln_mm_bt(1, n, i + 1, work + (i * m + j) * n, R, row);
            for (k = 0; k < i; k++)
                F[j * nn + k * n + i] = row[k];
        }
}

/* E_ab = sum_c D_abc F_bc x_c. work [n n]. */
ROLN_FN void rolni_exp_along(int n, const roln_real *D, const roln_real *F, const roln_real *x, roln_real *E, roln_real *work)
{
    int a, b, c;
    for (b = 0; b < n; b++)
        rolni_times_each(n, x, F + b * n, work + b * n);
    for (a = 0; a < n; a++)
        for (b = 0; b < n; b++) {
            const roln_real *Fx = work + b * n;
            roln_real s = 0;
            for (c = 0; c < n; c++)
                s += *D++ * Fx[c];
            *E++ = s;
        }
}

/* The same of M = exp_P(U), in the eigenbasis: with x = Q zd, y = Q zdd, F_j = R U_j R^T .. and E^j_ab = sum_c D_abc F_j,bc x_c
       M_j zd = Q^T (K o F_j) x,   M_vj zd = Q^T ((K o F_vj) x + (F_v o E^j + F_j o E^v) 1),   H_ij = sum_ab x_a F_i,ab E^j_ab */
#define ROLNI_EXP_JAC_MEM(X, n) \
    X(D, (n) * (n) * (n)) X(Ev, (n) * (n)) X(F, (n) * (n) * (n)) X(Fv, (n) * (n)) X(E, (n) * (n)) X(x, n) X(y, n) X(w, n) \
    X(rows, (n) * ROLN_TRI(n)) X(C, (n) * (n))
#define ROLNI_EXP_JAC_WORK(n, k) (0 ROLNI_EXP_JAC_MEM(ROLNI_SIZE, n) + (k) * (n) * (n))
ROLN_FN void rolni_exp_jac(const roln_lnn *f, int k, const rolni_tape *t, const roln_real *u, roln_real *V, roln_real *H,
                           roln_real *work)
{
    const int n = f->n, nn = n * n, tri = ROLN_TRI(n);
    const roln_real *K = t->K;
    int i, j, a, b;
    ROLNI_EXP_JAC_MEM(ROLNI_CARVE, n)
    rolni_exp_directions(n, n + k - 1, t->R, u, t->u + tri, F, D); /* and Ev; Fv behind F */
    roln_exp_dd2(n, t->l, K, D);
    roln_mm_bt(1, n, n, t->zd, t->Q, x);
    if (k > 1) {
        roln_mm_bt(1, n, n, t->zdd, t->Q, y);
        rolni_exp_along(n, D, Fv, x, Ev, work);
        for (i = 0; i < nn; i++)
            E[i] = K[i] * Fv[i];
        rolni_congr_t_set(n, t->Q, E, V + 2 * nn, work);
        rolni_exp_rows(n, t->R, K, x, rows, work);
        roln_mm_bt(n, tri, n, u + n * tri, rows, C);
    }
    for (j = 0; j < n; j++) {
        const roln_real *const Fj = F + j * nn;
        rolni_exp_along(n, D, Fj, x, E, work);
        for (a = 0; a < n; a++) {
            roln_real first = 0, second = k > 1 ? C[j * n + a] : 0;
            for (b = 0; b < n; b++) {
                const roln_real kf = K[a * n + b] * Fj[a * n + b];
                i = a * n + b;
                first += kf * x[b];
                if (k > 1) second += (kf * y[b] + Fv[i] * E[i]) + Fj[i] * Ev[i];
                E[i] *= x[a];
            }
            work[a] = first, w[a] = second;
        }
        roln_mm(1, n, n, work, t->Q, V + j * n);
        if (k > 1) roln_mm(1, n, n, w, t->Q, V + nn + j * n);
        roln_mm_bt(1, nn, j + 1, E, F, w);
        for (i = 0; i <= j; i++) {
            H[j * n + i] += w[i];
            if (i < j) H[i * n + j] += w[i];
        }
    }
}

/* The same behind SPD layers, by a backward of a row for each i: to D [2][n][n] is added all that -(M zdd + c) has (k = 2), or kin
   (k = 1). Number i is the scalar S of rolni_scalar with a = e_i, without g and d. Its cotangents of u, of u along e_i and along zd
   are gu_0, gu_1, gu_2, of which gu_1, the same for all i, is the one that rolni_curvature knows:
       dS/dz_j = gu_0 . u_j + gu_2 . u_vj + ..,   dS/dzd_j = gu_2 . u_j and what the pairs give. */
#define ROLNI_LAYERS_JAC_MEM(X, S, k) X(gu, (1 + (k)) * S(n) * ROLN_TRI(S(n))) X(e, S(n)) X(gzd, S(n))
#define ROLNI_LAYERS_JAC_WORK(S, k) \
    (0 ROLNI_LAYERS_JAC_MEM(ROLNI_SIZE, S, k) + ROLN_MAX((k) > 1 ? S(row_bwd_2) : S(row_bwd_1), S(n) * S(n)))
ROLN_FN void rolni_layers_jac(const roln_lnn *f, int k, const roln_real *theta, const rolni_tape *t, const roln_real *u,
                              roln_real *D, roln_real *work)
{
    const int n = f->n, nn = n * n, tri = ROLN_TRI(n), stride = n * tri;
    roln_real *const Dzd = D + nn, *product;
    rolni_row row;
    int i, j;
    ROLNI_LAYERS_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL, k)
    const rolni_pair inertia = {k > 1 ? ROLN_C(-1.0) : 0, e, k > 1 ? t->zdd : t->zd, NULL, NULL};
    const rolni_pair kinetic = {ROLN_C(0.5), t->zd, t->zd, gzd, gzd}, along_zd = {-1, e, t->zd, NULL, gzd};
    const rolni_pair pair[3] = {inertia, kinetic, along_zd};
    product = work;
    row.theta = theta, row.tape = t, row.r = 0, row.u[1] = t->u + tri;
    for (i = 0; i < n; i++) {
        rolni_zero(2 * n, e); /* and gzd */
        e[i] = 1, row.u[0] = u + i * tri;
        rolni_row_bwd(f, k, &row, pair, gu + i * tri, stride, NULL, work);
        for (j = 0; j < n; j++)
            Dzd[j * n + i] = gzd[j];
    }
    for (j = 0; j <= (k > 1 ? 2 : 0); j++) {
        roln_mm_bt(n, tri, n, u + (j == 1) * stride, gu + (j > 0) * 2 * stride, product);
        for (i = 0; i < nn; i++)
            (j < 2 ? D : Dzd)[i] += product[i];
    }
}

/* Derivatives of -(M zdd + c + g) by z, zd at fixed zdd (k = 2) or of kin - g (k = 1), on a tape filled with ROLNI_SECOND; with
   friction 2 g is (1 + l y sgn g) o g at fixed factors, so that the load in d is in it:
       by z_j:  1/2 grad D(zd^T M zd)[e_j] - M_j zdd - M_vj zd - D grad V[e_j],    by zd_j:  (zd^T M_i e_j)_i - M_j zd - M_v e_j,
   with k = 1 only the first terms and V. */
#define ROLNI_MOTION_JAC_MEM(X, S, k) X(x, (k) * S(n) * S(cossin)) X(u, (k) * S(n) * S(outputs)) X(V, 3 * S(n) * S(n))
#define ROLNI_MOTION_JAC_WORK(S, k) \
    (0 ROLNI_MOTION_JAC_MEM(ROLNI_SIZE, S, k) + \
     ROLN_MAX((k) > 1 ? S(curve_2) : S(curve_1), S(cholesky)     ? ROLNI_CHOLESKY_JAC_WORK(S(n), S(cols)) \
                                                 : S(layers) > 0 ? ROLNI_LAYERS_JAC_WORK(S, k) \
                                                                 : ROLNI_EXP_JAC_WORK(S(n), k)))
ROLN_FN void rolni_motion_jac(const roln_lnn *f, int k, const roln_real *theta, const rolni_tape *t, roln_real *D, roln_real *work)
{
    const int n = f->n, nn = n * n, outputs = rolni_outputs(f), cossin = rolni_cossin(f);
    int i;
    ROLNI_MOTION_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL, k)
    if (f->angles) rolni_see_all(f, k, t, x);
    rolni_zero(2 * nn, D);
    rolni_curvature(f, 1, 1, theta, t, f->angles ? x : NULL, NULL, D, work);
    for (i = 0; i < nn; i++)
        D[i] = -D[i];
    for (i = 0; i < n && f->friction > 1; i++)
        rolni_load_bwd(n, theta + rolni_friction_at(f), t, 0, D + i * n, D + i * n);
    rolni_curvature(f, 0, k, theta, t, f->angles ? x : NULL, u, D, work);
    if (f->layers > 0) {
        rolni_layers_jac(f, k, theta, t, u, D, work);
        return;
    }
    if (f->mass == ROLN_CHOLESKY) rolni_cholesky_jac(f, k, t, u, V, D, work);
    else rolni_exp_jac(f, k, t, u, V, D, work);
    for (i = 0; i < nn; i++) {
        D[nn + i] = V[i % n * n + i / n];
        if (k > 1) D[nn + i] -= V[i] + V[2 * nn + i], D[i] -= V[nn + i];
    }
}

/* D -= derivatives of drag W (|y| o y), y = W^T zd: W_j (|y| o y) + 2 W (|y| o W_j^T zd) by z_j and 2 W (|y| o W^T e_j) by zd_j.
   Wj: the derivatives W_j, one every `stride` numbers. work [4 n]. */
ROLN_FN void rolni_drag_jac(int n, const roln_real *zd, const roln_real *W, int stride, const roln_real *Wj, roln_real *D,
                            roln_real *work)
{
    roln_real *y = work, *yj = y + n, *d = yj + n;
    int i, j, k;
    roln_mm(1, n, n, zd, W, y);
    for (j = 0; j < n; j++)
        for (k = 0; k < 2; k++) {
            const roln_real *const Wk = Wj + j * stride;
            roln_real *const to = D + (k * n + j) * n;
            if (k == 0) roln_mm(1, n, n, zd, Wk, yj);
            else rolni_copy(n, W + j * n, yj);
            for (i = 0; i < n; i++)
                yj[i] *= 2 * ROLN_ABS(y[i]);
            roln_mm_bt(1, n, n, yj, W, d);
            for (i = 0; i < n; i++)
                to[i] -= d[i];
            if (k > 0) continue;
            for (i = 0; i < n; i++)
                yj[i] = y[i] * ROLN_ABS(y[i]);
            roln_mm_bt(1, n, n, yj, Wk, d);
            for (i = 0; i < n; i++)
                to[i] -= d[i];
        }
}

/* D -= derivatives of d = L L^T zd, of drag and of friction at fixed g. */
#define ROLNI_DISSIPATION_JAC_MEM(X, S) \
    X(x, S(n) * ROLNI_NET_INPUTS(S)) X(u, S(n) * S(damper)) X(out, S(n) * S(hidden)) X(L, S(n) * S(n)) \
    X(Lj, S(n) * S(n)) X(y, S(n)) X(yj, S(n)) X(d, 2 * S(n))
#define ROLNI_DISSIPATION_JAC_WORK(S) ROLN_MAX((S(damping) > 0) * (0 ROLNI_DISSIPATION_JAC_MEM(ROLNI_SIZE, S)), 2 * S(n))
ROLN_FN void rolni_dissipation_jac(const roln_lnn *f, const roln_real *theta, const rolni_tape *t, roln_real *D, roln_real *work)
{
    const int n = f->n, nn = n * n, damper = ROLNI_DAMPER(f->damping, n);
    int i, j;
    if (f->friction > 0) {
        roln_real *one = work, *slope = one + n;
        for (i = 0; i < n; i++)
            one[i] = 1, slope[i] = 0;
        rolni_friction_bwd(f, 1, theta + rolni_friction_at(f), t, one, slope, NULL);
        for (i = 0; i < n; i++)
            D[nn + i * (n + 1)] += slope[i];
    }
    if (f->damping) {
        const int hidden = roln_mlp_hidden(&f->damper_net), cossin = rolni_cossin(f);
        ROLNI_DISSIPATION_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL)
        rolni_see_all(f, 1, t, x);
        roln_mlp_forward(&f->damper_net, 0, n, 1, theta + rolni_damper_at(f), x, u, t->damper_slope, out);
        rolni_low(n, t->L, L);
        roln_mm(1, n, n, t->zd, L, y);
        for (j = 0; j < n; j++) { /* L_j L^T zd + L L_j^T zd, and L L^T e_j */
            rolni_low(n, u + j * damper, Lj);
            roln_mm(1, n, n, t->zd, Lj, yj);
            roln_mm_bt(1, n, n, y, Lj, d);
            roln_mm_bt(1, n, n, yj, L, d + n);
            for (i = 0; i < n; i++)
                D[j * n + i] -= d[i] + d[n + i];
            roln_mm_bt(1, n, n, L + j * n, L, d);
            for (i = 0; i < n; i++)
                D[nn + j * n + i] -= d[i];
        }
        if (f->damping > 1) rolni_drag_jac(n, t->zd, t->L + ROLN_TRI(n), damper, u + ROLN_TRI(n), D, y);
    }
}

/* W [n][n] = M^-1 of row r of a tape. work [2 n n]. */
ROLN_FN void rolni_minv_full(const roln_lnn *f, const rolni_tape *t, int r, roln_real *W, roln_real *work)
{
    const int n = f->n;
    int i;
    if (!rolni_formed(f)) {
        roln_spd_form(n, t->el + r * n, t->R + r * n * n, W, work);
        return;
    }
    for (i = 0; i < n; i++) {
        rolni_zero(n, W + i * n);
        W[i * (n + 1)] = 1;
        rolni_minv(f, t, r, W + i * n, W + i * n, work);
    }
}

/* Derivatives of roln_lnn_zdd, nb = 1, on its tape with keep = 2: D [2n][n] by s, row j by number j of it, at fixed tau_z, and
   W [n][n] by tau_z, row j by number j of it, M^-1 or, with driven coordinates, [M_ff^-1 0; -M_pf M_ff^-1 I]. Cost: of each layer
   n products, in the mass network 2n, all in one pass over its weights; n^4 for the mass matrix, behind SPD layers n backwards of
   a row. */
#define ROLN_LNN_ZDD_JAC_WORK(S) \
    ROLN_MAX(ROLN_MAX(S(row_jac_2), S(dissipation)), 2 * S(n) * S(n))
ROLN_FN void roln_lnn_zdd_jac(const roln_lnn *f, const roln_real *theta, roln_real *D, roln_real *W, roln_real *tape,
                              roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, 1, 1, 1, tape);
    int i, j;
    rolni_motion_jac(f, 2, theta, &t, D, work);
    rolni_dissipation_jac(f, theta, &t, D, work);
    rolni_minv_full(f, &t, 0, W, work);
    for (j = n - f->driven; j < n; j++) {
        for (i = 0; i < n; i++)
            W[j * n + i] = -t.M[j * n + i];
        rolni_minv(f, &t, 0, W + j * n, W + j * n, work);
        W[j * (n + 1)] = 1;
        for (i = 0; i < 2 * n; i++)
            D[i * n + j] = 0;
    }
    rolni_copy(2 * n * n, D, work);
    roln_mm(2 * n, n, n, work, W, D);
}

/* Inverse dynamics tau_z = M zdd + C(z, zd) w + g + d, w [nb][n] a velocity of its own (NULL: zd):
       C(z, zd) w = 1/2 (DM[zd] w + DM[w] zd - grad_z (zd^T M w)),   Christoffel symbols, so that DM[zd] - 2C is skew.
   s [2][nb][n], zdd [nb][n] in; tau_z [nb][n] (may be w or zdd) and the tape out. keep: 1 if roln_lnn_inverse_bwd is to follow,
   which needs w NULL, else 0. tape [ROLN_LNN_TAPE(S, dirs, keep, nb)], dirs = 2 with w, 1 without. Status of roln_lnn_zdd. */
#define ROLN_LNN_INVERSE_MEM(X, S, nb) X(out, (nb) * S(n))
#define ROLN_LNN_INVERSE_WORK(S, dirs, keep, nb) \
    ROLN_MAX(ROLNI_EVAL_WORK(S, dirs, keep, ROLNI_CORIOLIS, nb), \
             0 ROLN_LNN_INVERSE_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(2 * S(n), (dirs) > 1 ? S(row_dm) : 0))
ROLN_FN roln_status roln_lnn_inverse(const roln_lnn *f, int keep, int nb, const roln_real *theta, const roln_real *s,
                                     const roln_real *w, const roln_real *zdd, roln_real *tau_z, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    const rolni_tape t = rolni_tape_of(f, w ? 2 : 1, keep, nb, tape);
    roln_status st;
    int r, i;
    if ((st = rolni_eval(f, keep, nb, theta, s, w, ROLNI_CORIOLIS, tape, work)) != ROLN_OK) return st;
    {
        ROLN_LNN_INVERSE_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
        rolni_copy(nb * n, zdd, t.zdd);
        if (w) rolni_dm(f, nb, theta, &t, t.u + nb * rolni_outputs(f), t.zd, out, work);
        for (i = 0; i < nb * n; i++)
            out[i] = (w ? (t.dmv[i] + out[i]) / 2 : t.dmv[i]) - t.kin[i] + t.g[i] + t.d[i];
        for (r = 0; r < nb; r++) {
            rolni_mul(f, &t, r, t.zdd + r * n, work, work + n);
            for (i = 0; i < n; i++)
                out[r * n + i] += work[i];
        }
        if (!roln_all_finite(nb * n, out)) return ROLN_E_NOT_FINITE;
        rolni_copy(nb * n, out, tau_z);
    }
    return ROLN_OK;
}

/* Backward of roln_lnn_inverse without w on its tape, with cotangent y [nb][n] of tau_z. Adds to gs [2][nb][n], gzdd [nb][n]
   and gtheta (each may be NULL). */
#define ROLN_LNN_INVERSE_BWD_MEM(X, S, nb) X(lambda, (nb) * S(n))
#define ROLN_LNN_INVERSE_BWD_WORK(S, nb) (0 ROLN_LNN_INVERSE_BWD_MEM(ROLNI_SIZE, S, nb) + ROLNI_ADJOINT_WORK(S, 2, nb))
ROLN_FN void roln_lnn_inverse_bwd(const roln_lnn *f, int nb, const roln_real *theta, const roln_real *y, roln_real *gs,
                                  roln_real *gzdd, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const int n = f->n;
    int i;
    ROLN_LNN_INVERSE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    for (i = 0; i < nb * n; i++)
        lambda[i] = -y[i];
    rolni_motion_bwd(f, nb, theta, lambda, gs, gzdd, gtheta, tape, work);
}

/* Terms of the equations of motion at one state: M [n][n], c = C zd, g, d [n], R zd and friction, kinetic and potential energy T,
   V. */
typedef struct {
    roln_real *M, *c, *g, *d, *T, *V; /* each may be NULL */
} roln_dynamics_out;

/* The terms at s = [z; zd], nb = 1. tape [ROLN_LNN_TAPE(S, 1, 0, 1)]. With E = T + V the power balance is
   dE/dt = zd^T (tau_z - d). Status of roln_lnn_zdd; out is written only on ROLN_OK. */
#define ROLN_LNN_DYNAMICS_MEM(X, S) X(M, S(n) * S(n)) X(el, S(n))
#define ROLN_LNN_DYNAMICS_WORK(S) \
    ROLN_MAX(ROLNI_EVAL_WORK(S, 1, 0, ROLNI_CORIOLIS, 1), \
             (1 - S(formed)) * (0 ROLN_LNN_DYNAMICS_MEM(ROLNI_SIZE, S) + ROLN_SPD_FORM_WORK(S(n))))
ROLN_FN roln_status roln_lnn_dynamics(const roln_lnn *f, const roln_real *theta, const roln_real *s, const roln_dynamics_out *out,
                                      roln_real *tape, roln_real *work)
{
    const int n = f->n, nn = n * n;
    const int wanted = out->c ? ROLNI_CORIOLIS : out->g ? ROLNI_GRADIENT : out->d ? ROLNI_ALL_OF_D(f->friction) : ROLNI_MASS;
    const rolni_tape t = rolni_tape_of(f, 1, 0, 1, tape);
    const roln_status st = rolni_eval(f, 0, 1, theta, s, NULL, wanted, tape, work);
    const roln_real *mass = t.M;
    roln_real twice;
    int i;
    if (st != ROLN_OK) return st;
    rolni_mul(f, &t, 0, t.zd, work, work + n);
    twice = roln_dot(n, t.zd, work); /* zd^T M zd */
    if (!rolni_formed(f)) {
        ROLN_LNN_DYNAMICS_MEM(ROLNI_CARVE, ROLNI_LOCAL)
        for (i = 0; i < n; i++)
            el[i] = t.K[i * (n + 1)];
        roln_spd_form(n, el, t.Q, M, work);
        mass = M;
    }
    if (!roln_all_finite(nn, mass) || !roln_finite(twice) || !roln_finite(t.v[0]) || !roln_all_finite(n, t.d) ||
        (wanted >= ROLNI_GRADIENT && (!roln_all_finite(n, t.kin) || !roln_all_finite(n, t.g))) ||
        (wanted == ROLNI_CORIOLIS && !roln_all_finite(n, t.dmv)))
        return ROLN_E_NOT_FINITE;
    if (out->M) rolni_copy(nn, mass, out->M);
    for (i = 0; i < n; i++) {
        if (out->c) out->c[i] = t.dmv[i] - t.kin[i];
        if (out->g) out->g[i] = t.g[i];
        if (out->d) out->d[i] = t.d[i];
    }
    if (out->T) *out->T = twice / 2;
    if (out->V) *out->V = t.v[0];
    return ROLN_OK;
}

/* ---- 5 integrators ---------------------------------------------------------------------------- */

enum {
    ROLN_EULER = 1,    /* explicit, the paper's; order 1 */
    ROLN_RK4 = 2,      /* the classical Runge-Kutta method; order 4 */
    ROLN_MIDPOINT = 3, /* the implicit midpoint rule in (z, p = M zd). It is variational: dz ^ dp is preserved. Order 2 */
    ROLN_LEAPFROG = 4  /* zd+ = zd + h zdd(z + h/2 zd, zd), z+ = z + h/2 (zd + zd+), one evaluation. Order 2 in what forces depend
                          on z, order 1 in what they depend on zd */
};

#define ROLN_MIDPOINT_ITERS 10 /* fixed-point iterations of a midpoint step; the last may move zd by 1000 eps max(1, |zd|) */

/* A generalised force that depends on z, such as a held full-space torque reduced by J(z)^T, and may depend on zd. The caller gives
   the functions: they are the calls that leave this header upwards. z [nb][n] always has zd [nb][n] behind it, and gz has the
   gradient by zd. eval writes tau_z [nb][n]; bwd adds to gz [2][nb][n] for the cotangent y [nb][n] of tau_z and, if params, to the
   gradient of the parameters in ctx; jac writes the derivatives of tau_z at one z, H [n][n], row j by z_j, and G [size][n], a row
   for each number that the force is made of (NULL: not wanted). jac_zd writes H [n][n], row j by zd_j. It is called after jac at
   the same state, with no other call between. NULL: the force does not depend on zd. Only roln_lnn_step_jac calls jac and jac_zd.
   Other functions that are never called may be NULL. */
typedef struct {
    void (*eval)(void *ctx, int nb, const roln_real *z, roln_real *tau_z);
    void (*bwd)(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz);
    void (*jac)(void *ctx, const roln_real *z, roln_real *H, roln_real *G);
    void (*jac_zd)(void *ctx, const roln_real *z, roln_real *H);
    void *ctx;
} roln_force;

/* What moves: a Lagrangian network with its weights, under a force. The shape f stays an argument of its own, so that a compiler
   that knows it drops what this shape does not use. */
typedef struct {
    const roln_real *theta;
    const roln_force *force; /* NULL: none */
} roln_system;

/* sd = F(s) = [zd; zdd], the force taken at the z of s. sd may not be s. */
#define ROLNI_STAGE_WORK(S, keep, nb) ROLN_LNN_ZDD_WORK(S, keep, nb)
ROLN_FN roln_status rolni_stage(const roln_lnn *f, const roln_system *sys, int keep, int nb, const roln_real *s, roln_real *sd,
                                roln_real *tape, roln_real *work)
{
    const roln_force *force = sys->force;
    const int m = nb * f->n;
    roln_status st;
    if (force) force->eval(force->ctx, nb, s, sd); /* tau_z, where zd will be */
    st = roln_lnn_zdd(f, keep, nb, sys->theta, s, force ? sd : NULL, sd + m, tape, work);
    rolni_copy(m, s + m, sd);
    return st;
}

/* Backward of rolni_stage at the state on its tape: gs += DF^T gsd. */
#define ROLNI_STAGE_BWD_MEM(X, S, nb) X(gtau_z, (nb) * S(n))
#define ROLNI_STAGE_BWD_WORK(S, nb) (0 ROLNI_STAGE_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_LNN_ZDD_BWD_WORK(S, nb))
ROLN_FN void rolni_stage_bwd(const roln_lnn *f, const roln_system *sys, int nb, const roln_real *gsd, roln_real *gs,
                             roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const roln_force *force = sys->force;
    const int n = f->n, m = nb * n;
    int i;
    ROLNI_STAGE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    for (i = 0; i < m; i++)
        gs[m + i] += gsd[i];
    rolni_zero(m, gtau_z);
    roln_lnn_zdd_bwd(f, nb, sys->theta, gsd + m, gs, gtau_z, gtheta, tape, work);
    if (force) force->bwd(force->ctx, nb, rolni_tape_of(f, 1, 1, nb, tape).x, gtau_z, 1, gs);
}

/* y = M x, y = M^-1 x for every row of a filled tape. work [n]. */
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

/* A tape filled at sm = [z_m; v], and F = 1/2 grad_z (v^T M v) - g - d + tau_z there: the impulse per unit of time. F [nb][n] out;
   work of rolni_eval with ROLNI_GRADIENT. */
ROLN_FN roln_status rolni_impulse(const roln_lnn *f, const roln_system *sys, int keep, int nb, const roln_real *sm, roln_real *F,
                                  roln_real *tape, roln_real *work)
{
    const rolni_tape t = rolni_tape_of(f, 1, keep, nb, tape);
    const roln_force *force = sys->force;
    roln_status st;
    int i;
    if (force) force->eval(force->ctx, nb, sm, F);
    if ((st = rolni_eval(f, keep, nb, sys->theta, sm, NULL, ROLNI_GRADIENT, tape, work)) != ROLN_OK) return st;
    for (i = 0; i < nb * f->n; i++)
        F[i] = t.kin[i] - t.g[i] - t.d[i] + (force ? F[i] : 0);
    return ROLN_OK;
}

/* Backward of momentum + a^T (F - tau_z) at (z_m, v) on the tape of rolni_impulse, momentum = c mu^T M v at fixed v. Adds to
   gz, gv [nb][n] and gtheta (may be NULL); the caller adds what the force gives. */
ROLN_FN void rolni_impulse_bwd(const roln_lnn *f, int nb, const roln_real *theta, const rolni_pair *momentum, const roln_real *a,
                               roln_real *gz, roln_real *gv, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const rolni_tape t = rolni_tape_of(f, 1, 1, nb, tape);
    const rolni_pair kinetic = {ROLN_C(0.5), t.zd, t.zd, gv, gv};
    rolni_scalar of;
    of.k = 1, of.a = a, of.pair[0] = *momentum, of.pair[1] = kinetic;
    rolni_adjoint(f, nb, theta, &of, gz, gv, gtheta, tape, work);
}

/* gz += d/dz of momentum = c p^T M x at the state on the tape, p and x [nb][n] held fixed; gtheta likewise. */
ROLN_FN void rolni_momentum_bwd(const roln_lnn *f, int nb, const roln_real *theta, const rolni_pair *momentum, roln_real *gz,
                                roln_real *gtheta, roln_real *tape, roln_real *work)
{
    rolni_scalar of;
    of.k = 0, of.a = NULL, of.pair[0] = *momentum;
    rolni_adjoint(f, nb, theta, &of, gz, NULL, gtheta, tape, work);
}

/* The variational midpoint rule (roln_lnn_step): with z_m = z + h/2 v, F = 1/2 grad_z(v^T M v) - g - d + tau_z at (z_m, v),
       M(z_m) v = p + h/2 F,   z+ = z + h v,   p+ = p + h F,   p = M(z) zd,   zd+ = M(z+)^-1 p+.
   stride: from one tape to the next, 0 for one. */
#define ROLNI_MIDPOINT_MEM(X, S, nb) X(p, (nb) * S(n)) X(F, (nb) * S(n)) X(sm, 2 * (nb) * S(n))
#define ROLNI_MIDPOINT_WORK(S, keep, nb) \
    (0 ROLNI_MIDPOINT_MEM(ROLNI_SIZE, S, nb) + \
     ROLN_MAX(ROLNI_EVAL_WORK(S, 1, keep, ROLNI_GRADIENT, nb), 2 * (nb) * S(n) + S(n)))
ROLN_FN roln_status rolni_midpoint(const roln_lnn *f, const roln_system *sys, int keep, int nb, roln_real h, const roln_real *s,
                                   roln_real *sn, roln_real *tape, int stride, roln_real *work)
{
    const int n = f->n, m = nb * n;
    const rolni_tape t0 = rolni_tape_of(f, 1, keep, nb, tape), tm = rolni_tape_of(f, 1, keep, nb, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, 1, keep, nb, tape + 2 * stride);
    roln_real *v, *rhs, *next;
    roln_status st;
    int it, i, settled = 1;
    ROLNI_MIDPOINT_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    v = sm + m, rhs = work, next = rhs + m;
    if ((st = rolni_eval(f, keep, nb, sys->theta, s, NULL, ROLNI_MASS, tape, work)) != ROLN_OK) return st;
    rolni_mul_all(f, nb, &t0, s + m, p, work);
    rolni_copy(m, s + m, v);
    for (it = 0;; it++) {
        for (i = 0; i < m; i++)
            sm[i] = s[i] + h / 2 * v[i];
        if ((st = rolni_impulse(f, sys, keep, nb, sm, F, tape + stride, work)) != ROLN_OK) return st;
        if (it == ROLN_MIDPOINT_ITERS) break;
        for (i = 0; i < m; i++)
            rhs[i] = p[i] + h / 2 * F[i];
        rolni_minv_all(f, nb, &tm, rhs, next, next + m);
        for (settled = 1, i = 0; i < m; i++) { /* NaN does not settle */
            settled &= ROLN_ABS(next[i] - v[i]) <= 1000 * ROLN_EPS * ROLN_MAX(1, ROLN_ABS(next[i]));
            v[i] = next[i];
        }
    }
    if (!settled) return ROLN_E_NO_CONVERGENCE;
    for (i = 0; i < m; i++) {
        p[i] += h * F[i];
        sm[i] = s[i] + h * v[i];
    }
    if ((st = rolni_eval(f, keep, nb, sys->theta, sm, NULL, ROLNI_MASS, tape + 2 * stride, work)) != ROLN_OK) return st;
    rolni_minv_all(f, nb, &t1, p, t1.zdd, work);
    rolni_copy(m, sm, sn);
    rolni_copy(m, t1.zdd, sn + m);
    return ROLN_OK;
}

/* Backward of rolni_midpoint. The cotangent mu of the implicit equation solves, with a = h g_p+ + h/2 mu and
   S = a^T F - mu^T M v at z_m,   M mu = h g_z+ + dS/dv|_M + h/2 dS/dz_m,   by the same number of iterations. */
#define ROLNI_MIDPOINT_BWD_MEM(X, S, nb) \
    X(gz, (nb) * S(n)) X(gp, (nb) * S(n)) X(mu, (nb) * S(n)) X(a, (nb) * S(n)) X(gm, (nb) * S(n)) X(gv, (nb) * S(n))
#define ROLNI_MIDPOINT_BWD_WORK(S, nb) (0 ROLNI_MIDPOINT_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(ROLNI_ADJOINT_WORK(S, 1, nb), S(n)))
ROLN_FN void rolni_midpoint_bwd(const roln_lnn *f, const roln_system *sys, int nb, roln_real h, const roln_real *gsn, roln_real *gs,
                                roln_real *gtheta, roln_real *tape, int stride, roln_real *work)
{
    const roln_real *theta = sys->theta;
    const roln_force *force = sys->force;
    const int n = f->n, m = nb * n;
    const rolni_tape t0 = rolni_tape_of(f, 1, 1, nb, tape), tm = rolni_tape_of(f, 1, 1, nb, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, 1, 1, nb, tape + 2 * stride);
    int it, i;
    ROLNI_MIDPOINT_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    const rolni_pair first = {1, gp, t0.zd, NULL, NULL}, implicit = {-1, mu, tm.zd, NULL, NULL};
    const rolni_pair last = {-1, gp, t1.zdd, NULL, NULL};
    rolni_minv_all(f, nb, &t1, gsn + m, gp, work);
    rolni_copy(m, gsn, gz);
    rolni_momentum_bwd(f, nb, theta, &last, gz, gtheta, tape + 2 * stride, work);
    rolni_zero(m, mu);
    for (it = 0;; it++) {
        const int final = it == ROLN_MIDPOINT_ITERS;
        rolni_zero(m, gm), rolni_zero(m, gv);
        for (i = 0; i < m; i++)
            a[i] = h * gp[i] + h / 2 * mu[i];
        rolni_impulse_bwd(f, nb, theta, &implicit, a, gm, gv, final ? gtheta : NULL, tape + stride, work);
        if (force) force->bwd(force->ctx, nb, tm.x, a, final, gm);
        if (final) break;
        for (i = 0; i < m; i++)
            gv[i] += h * gz[i] + h / 2 * gm[i];
        rolni_minv_all(f, nb, &tm, gv, mu, work);
    }
    for (i = 0; i < m; i++) { /* p = M(z) zd */
        gs[i] += gz[i] + gm[i];
        gp[i] += mu[i];
    }
    rolni_momentum_bwd(f, nb, theta, &first, gs, gtheta, tape, work);
    rolni_mul_all(f, nb, &t0, gp, gv, work);
    for (i = 0; i < m; i++)
        gs[m + i] += gv[i];
}

/* Stages of an explicit step, and tapes of a step that its backward needs. */
#define ROLN_STAGES(scheme) ((scheme) == ROLN_RK4 ? 4 : (scheme) == ROLN_MIDPOINT ? 3 : 1)

/* Weight of stage j in s+, and the part of h by which it moves the state of the next stage. */
ROLN_FN roln_real rolni_stage_weight(int scheme, int j, roln_real h)
{
    return scheme == ROLN_EULER ? h : h * (j == 0 || j == 3 ? ROLN_C(1.0) / 6 : ROLN_C(1.0) / 3);
}

ROLN_FN roln_real rolni_stage_move(int j, roln_real h)
{
    return j < 2 ? h / 2 : h;
}

/* The state at which leapfrog evaluates: m = nb n positions half a step of h on. */
ROLN_FN void rolni_half_step(int m, roln_real h, const roln_real *s, roln_real *x)
{
    int i;
    for (i = 0; i < m; i++) {
        x[i] = s[i] + h / 2 * s[m + i];
        x[m + i] = s[m + i];
    }
}

/* One step of length h from s to sn, both [2][nb][n] (sn may be s). keep: 1 if roln_lnn_step_bwd is to follow, else 0.
   tape: ROLN_STAGES(scheme) tapes [ROLN_LNN_TAPE(S, 1, 1, nb)] with keep, one [ROLN_LNN_TAPE(S, 1, 0, nb)] without.
   Status of roln_lnn_zdd; ROLN_E_NO_CONVERGENCE: h is too long for the midpoint rule. sn is written only on ROLN_OK. */
#define ROLN_LNN_STEP_MEM(X, S, scheme, nb) \
    X(next, 2 * (nb) * S(n)) \
    X(sx, ((scheme) == ROLN_RK4 || (scheme) == ROLN_LEAPFROG) * 2 * (nb) * S(n)) \
    X(k, ((scheme) != ROLN_MIDPOINT) * 2 * (nb) * S(n))
#define ROLNI_STEP_WORK(S, scheme, nb, stage, midpoint) \
    (0 ROLN_LNN_STEP_MEM(ROLNI_SIZE, S, scheme, nb) + ((scheme) == ROLN_MIDPOINT ? (midpoint) : (stage)))
#define ROLN_LNN_STEP_WORK(S, scheme, keep, nb) \
    ROLNI_STEP_WORK(S, scheme, nb, ROLNI_STAGE_WORK(S, keep, nb), ROLNI_MIDPOINT_WORK(S, keep, nb))
ROLN_FN roln_status roln_lnn_step(const roln_lnn *f, const roln_system *sys, int scheme, int keep, int nb, roln_real h,
                                  const roln_real *s, roln_real *sn, roln_real *tape, roln_real *work)
{
    const int n = f->n, m2 = 2 * nb * n, stride = keep ? roln_lnn_tape(f, 1, 1, nb) : 0;
    const int stages = ROLN_STAGES(scheme);
    roln_status st;
    int j, i;
    ROLN_LNN_STEP_MEM(ROLNI_CARVE, ROLNI_LOCAL, scheme, nb)
    if (scheme == ROLN_MIDPOINT) {
        if ((st = rolni_midpoint(f, sys, keep, nb, h, s, next, tape, stride, work)) != ROLN_OK) return st;
    } else if (scheme == ROLN_LEAPFROG) {
        const int m = nb * n;
        rolni_half_step(m, h, s, sx);
        if ((st = rolni_stage(f, sys, keep, nb, sx, k, tape, work)) != ROLN_OK) return st;
        for (i = 0; i < m; i++) {
            next[m + i] = s[m + i] + h * k[m + i];
            next[i] = sx[i] + h / 2 * next[m + i];
        }
    } else {
        rolni_copy(m2, s, next);
        for (j = 0; j < stages; j++) {
            const roln_real b = rolni_stage_weight(scheme, j, h), c = rolni_stage_move(j, h);
            if ((st = rolni_stage(f, sys, keep, nb, j ? sx : s, k, tape + j * stride, work)) != ROLN_OK) return st;
            for (i = 0; i < m2; i++)
                next[i] += b * k[i];
            for (i = 0; i < m2 && j + 1 < stages; i++)
                sx[i] = s[i] + c * k[i];
        }
    }
    if (!roln_all_finite(m2, next)) return ROLN_E_NOT_FINITE;
    rolni_copy(m2, next, sn);
    return ROLN_OK;
}

/* Backward of roln_lnn_step through its tapes: gsn [2][nb][n] in; adds to gs [2][nb][n], gtheta (may be NULL) and,
   through force->bwd, to what the force depends on. gs may not be gsn. */
#define ROLN_LNN_STEP_BWD_MEM(X, S, nb) X(gx, 2 * (nb) * S(n)) X(gk, 2 * (nb) * S(n))
#define ROLNI_STEP_BWD_WORK(S, scheme, nb, stage, midpoint) \
    ((scheme) == ROLN_MIDPOINT ? (midpoint) : 0 ROLN_LNN_STEP_BWD_MEM(ROLNI_SIZE, S, nb) + (stage))
#define ROLN_LNN_STEP_BWD_WORK(S, scheme, nb) \
    ROLNI_STEP_BWD_WORK(S, scheme, nb, ROLNI_STAGE_BWD_WORK(S, nb), ROLNI_MIDPOINT_BWD_WORK(S, nb))
ROLN_FN void roln_lnn_step_bwd(const roln_lnn *f, const roln_system *sys, int scheme, int nb, roln_real h, const roln_real *gsn,
                               roln_real *gs, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const int n = f->n, m2 = 2 * nb * n, stride = roln_lnn_tape(f, 1, 1, nb);
    int j, i;
    if (scheme == ROLN_MIDPOINT) {
        rolni_midpoint_bwd(f, sys, nb, h, gsn, gs, gtheta, tape, stride, work);
        return;
    }
    {
        ROLN_LNN_STEP_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
        rolni_zero(m2, gx);
        if (scheme == ROLN_LEAPFROG) {
            const int m = nb * n;
            for (i = 0; i < m; i++) {
                gk[i] = 0;
                gk[m + i] = h * (gsn[m + i] + h / 2 * gsn[i]);
            }
            rolni_stage_bwd(f, sys, nb, gk, gx, gtheta, tape, work);
            for (i = 0; i < m; i++) {
                gs[i] += gsn[i] + gx[i];
                gs[m + i] += h * gsn[i] + gsn[m + i] + h / 2 * gx[i] + gx[m + i];
            }
            return;
        }
        for (i = 0; i < m2; i++)
            gs[i] += gsn[i];
        for (j = ROLN_STAGES(scheme) - 1; j >= 0; j--) { /* k_j enters s+ with weight b, the next stage with c */
            const roln_real b = rolni_stage_weight(scheme, j, h), c = rolni_stage_move(j, h);
            for (i = 0; i < m2; i++) {
                gk[i] = b * gsn[i] + c * gx[i];
                gx[i] = 0;
            }
            rolni_stage_bwd(f, sys, nb, gk, gx, gtheta, tape + j * stride, work);
            for (i = 0; i < m2; i++)
                gs[i] += gx[i];
        }
    }
}

/* N [n][n]: row j = DM[e_j] x, on a tape of one state with keep. */
#define ROLNI_MOMENTUM_JAC_MEM(X, S) \
    X(in, S(n) * ROLNI_NET_INPUTS(S)) X(u, S(n) * S(outputs)) X(out, S(n) * S(hidden))
#define ROLNI_MOMENTUM_JAC_WORK(S) (0 ROLNI_MOMENTUM_JAC_MEM(ROLNI_SIZE, S) + S(row_dm))
ROLN_FN void rolni_momentum_jac(const roln_lnn *f, const roln_real *theta, const rolni_tape *t, const roln_real *x, roln_real *N,
                                roln_real *work)
{
    const int n = f->n, hidden = roln_mlp_hidden(&f->mass_net), outputs = rolni_outputs(f), cossin = rolni_cossin(f);
    int j;
    ROLNI_MOMENTUM_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_see_all(f, 1, t, in);
    roln_mlp_forward(&f->mass_net, 0, n, 1, theta, in, u, t->mass_slope, out);
    for (j = 0; j < n; j++)
        rolni_dm(f, 1, theta, t, u + j * rolni_outputs(f), x, N + j * n, work);
}

/* The derivatives of a force (NULL: 0) at sm [2n] are added to those by z, Fz, and by zd, Fv [n][n]; G as force->jac. H [n][n]:
   scratch. */
ROLN_FN void rolni_force_jac(int n, const roln_force *force, const roln_real *sm, roln_real *Fz, roln_real *Fv, roln_real *G,
                             roln_real *H)
{
    int i;
    if (force) force->jac(force->ctx, sm, H, G);
    for (i = 0; i < n * n; i++)
        Fz[i] += force ? H[i] : 0;
    if (!force || !force->jac_zd) return;
    force->jac_zd(force->ctx, sm, H);
    for (i = 0; i < n * n; i++)
        Fv[i] += H[i];
}

/* Derivatives of the midpoint rule on its three tapes: J as roln_lnn_step_jac. In rows, with N = DM[.] v at z_m, N_0 = DM[.] zd,
   N_1 = DM[.] zd+, Q = N - h/2 F_z and G = dF by the force, the rows of v, by z, zd and the force, are
       v' = [N_0 - Q; M_0; h/2 G] M_m^-1 (I + h/2 (Q - F_v) M_m^-1)^-1,
   those of p+ are p' + h (z_m' F_z + v' F_v + G), those of z+ are z' + h v', and zd+' = (p+' - z+' N_1) M_1^-1.
   ROLN_E_ILL_CONDITIONED if there are none: v is no function of s there. */
#define ROLNI_MIDPOINT_JAC_MEM(X, S, size) \
    X(sm, 2 * S(n)) X(N0, S(n) * S(n)) X(N1, S(n) * S(n)) X(Q, S(n) * S(n)) X(Fz, S(n) * S(n)) X(Fv, S(n) * S(n)) \
    X(A, S(n) * S(n)) X(P, S(n) * S(n)) X(W, S(n) * S(n)) X(G, (size) * S(n)) X(R, (2 * S(n) + (size)) * S(n)) \
    X(v, (2 * S(n) + (size)) * S(n))
#define ROLNI_MIDPOINT_ROW_WORK(S) \
    ROLN_MAX(S(stage_1), \
             ROLN_MAX(ROLN_MAX(ROLNI_MOMENTUM_JAC_WORK(S), S(row_jac_1)), \
                      ROLN_MAX(S(dissipation), 2 * S(n) * S(n))))
#define ROLNI_MIDPOINT_JAC_WORK(S, size) (0 ROLNI_MIDPOINT_JAC_MEM(ROLNI_SIZE, S, size) + S(midpoint_row))
ROLN_FN roln_status rolni_midpoint_jac(const roln_lnn *f, const roln_system *sys, int size, roln_real h, roln_real *J,
                                       roln_real *tape, int stride, roln_real *work)
{
    const roln_real *theta = sys->theta;
    const int n = f->n, nn = n * n, rows = 2 * n + size;
    const rolni_tape t0 = rolni_tape_of(f, 1, 1, 1, tape), tm = rolni_tape_of(f, 1, 1, 1, tape + stride);
    const rolni_tape t1 = rolni_tape_of(f, 1, 1, 1, tape + 2 * stride);
    roln_status st;
    int i, j;
    ROLNI_MIDPOINT_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL, size)
    rolni_momentum_jac(f, theta, &t0, t0.zd, N0, work);
    rolni_momentum_jac(f, theta, &t1, t1.zdd, N1, work);
    rolni_copy(2 * n, tm.x, sm);
    if ((st = rolni_eval(f, 1, 1, theta, sm, NULL, ROLNI_SECOND, tape + stride, work)) != ROLN_OK) return st;
    rolni_motion_jac(f, 1, theta, &tm, Fz, work); /* F_z and F_v, which is N^T */
    for (i = 0; i < nn; i++)
        Q[i] = Fv[i % n * n + i / n];
    rolni_dissipation_jac(f, theta, &tm, Fz, work);
    rolni_force_jac(n, sys->force, sm, Fz, Fv, size > 0 ? G : NULL, P);
    for (i = 0; i < nn; i++) {
        Q[i] -= h / 2 * Fz[i];
        P[i] = h / 2 * (Q[i] - Fv[i]);
    }
    rolni_minv_full(f, &tm, 0, W, work);
    roln_mm(n, n, n, P, W, A);
    for (i = 0; i < n; i++)
        A[i * (n + 1)] += 1;
    if ((st = roln_inv(n, A, P, work)) != ROLN_OK) return st;
    roln_mm(n, n, n, W, P, A);
    for (i = 0; i < nn; i++)
        R[i] = N0[i] - Q[i];
    for (j = 0; j < n; j++) {
        rolni_zero(n, sm);
        sm[j] = 1;
        rolni_mul(f, &t0, 0, sm, R + nn + j * n, work);
    }
    for (i = 0; i < size * n; i++)
        R[2 * nn + i] = h / 2 * G[i];
    roln_mm(rows, n, n, R, A, v);
    for (i = 0; i < nn; i++) { /* p+ */
        R[i] = N0[i] + h * Fz[i];
        P[i] = h * (Fv[i] + h / 2 * Fz[i]);
        N1[i] = -N1[i];
    }
    for (i = 0; i < size * n; i++)
        R[2 * nn + i] = h * G[i];
    rolni_mm(rows, n, n, v, ROLNI_AS(size_t, n), 1, P, 1, R);
    for (i = 0; i < rows * n; i++) /* z+ */
        v[i] = h * v[i] + (i < nn && i % (n + 1) == 0);
    rolni_mm(rows, n, n, v, ROLNI_AS(size_t, n), 1, N1, 1, R);
    rolni_minv_full(f, &t1, 0, W, work);
    for (j = 0; j < rows; j++) {
        rolni_copy(n, v + j * n, J + 2 * j * n);
        roln_mm(1, n, n, R + j * n, W, J + 2 * j * n + n);
    }
    return ROLN_OK;
}

/* Derivatives of a stage as rows, X [2n + size][2n] those of its state (NULL: the first stage, whose state is s): K [2n + size][n],
   those of zdd, on its tape; those of zd are in X. */
#define ROLNI_STAGE_JAC_MEM(X, S, size) \
    X(D, 2 * S(n) * S(n)) X(W, S(n) * S(n)) X(H, S(n) * S(n)) X(G, (size) * S(n))
#define ROLNI_STAGE_JAC_WORK(S, size) (0 ROLNI_STAGE_JAC_MEM(ROLNI_SIZE, S, size) + S(zdd_jac))
ROLN_FN void rolni_stage_jac(const roln_lnn *f, const roln_system *sys, int size, const roln_real *X, roln_real *K, roln_real *tape,
                             roln_real *work)
{
    const roln_force *force = sys->force;
    const int n = f->n;
    const size_t step = ROLNI_AS(size_t, n);
    ROLNI_STAGE_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL, size)
    roln_lnn_zdd_jac(f, sys->theta, D, W, tape, work);
    if (force) {
        const roln_real *const z = rolni_tape_of(f, 1, 1, 1, tape).x;
        force->jac(force->ctx, z, H, size > 0 ? G : NULL);
        rolni_mm(n, n, n, H, step, 1, W, 1, D);
        if (force->jac_zd) {
            force->jac_zd(force->ctx, z, H);
            rolni_mm(n, n, n, H, step, 1, W, 1, D + n * n);
        }
    }
    if (X) {
        roln_mm(2 * n + size, 2 * n, n, X, D, K);
    } else {
        rolni_copy(2 * n * n, D, K);
        rolni_zero(size * n, K + 2 * n * n);
    }
    if (size > 0) rolni_mm(size, n, n, G, step, 1, W, 1, K + 2 * n * n);
}

/* roln_lnn_step of one state, the same bits, and its derivatives: J [2n + size][2n], row j those of sn by number j of s, behind
   them those by the numbers that the force is made of, a row for each row of G of force->jac, or size = 0: not wanted. The stages
   go forward one by one, each with roln_lnn_zdd_jac; in rows K' = X DF, X' = I + c K'. sn may be s. tape: ROLN_JAC_TAPES(scheme)
   tapes [ROLN_LNN_TAPE(S, 1, 1, 1)]. Status of roln_lnn_step; ROLN_E_ILL_CONDITIONED: the midpoint rule has no derivative. sn is
   written only on ROLN_OK, and only then is J of use. */
#define ROLN_JAC_TAPES(scheme) ((scheme) == ROLN_MIDPOINT ? 3 : 1)
#define ROLN_LNN_STEP_JAC_MEM(X, S, size) \
    X(next, 2 * S(n)) X(sx, 2 * S(n)) X(k, 2 * S(n)) X(Xs, (2 * S(n) + (size)) * 2 * S(n)) X(K, (2 * S(n) + (size)) * S(n))
#define ROLN_LNN_STEP_JAC_WORK(S, scheme, size) \
    ((scheme) == ROLN_MIDPOINT \
    ? 2 * S(n) + ROLN_MAX(S(step_1), ROLNI_MIDPOINT_JAC_WORK(S, size)) \
    : 0 ROLN_LNN_STEP_JAC_MEM(ROLNI_SIZE, S, size) + ROLN_MAX(S(stage_1), ROLNI_STAGE_JAC_WORK(S, size)))
ROLN_FN roln_status roln_lnn_step_jac(const roln_lnn *f, const roln_system *sys, int scheme, int size, roln_real h,
                                      const roln_real *s, roln_real *sn, roln_real *J, roln_real *tape, roln_real *work)
{
    const int n = f->n, n2 = 2 * n, rows = n2 + size, stages = ROLN_STAGES(scheme);
    roln_status st;
    int j, i, r;
    if (scheme == ROLN_MIDPOINT) {
        roln_real *const to = work;
        work += n2;
        if ((st = roln_lnn_step(f, sys, scheme, 1, 1, h, s, to, tape, work)) != ROLN_OK) return st;
        if ((st = rolni_midpoint_jac(f, sys, size, h, J, tape, roln_lnn_tape(f, 1, 1, 1), work)) != ROLN_OK) return st;
        rolni_copy(n2, to, sn);
        return ROLN_OK;
    }
    {
        ROLN_LNN_STEP_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL, size)
        rolni_copy(n2, s, next);
        for (i = 0; i < rows * n2; i++)
            J[i] = Xs[i] = i < n2 * n2 && i % (n2 + 1) == 0;
        if (scheme == ROLN_LEAPFROG) {
            rolni_half_step(n, h, s, sx);
            for (i = 0; i < n; i++)
                Xs[(n + i) * n2 + i] = h / 2;
            if ((st = rolni_stage(f, sys, 2, 1, sx, k, tape, work)) != ROLN_OK) return st;
            rolni_stage_jac(f, sys, size, Xs, K, tape, work);
            for (i = 0; i < n; i++) {
                next[n + i] += h * k[n + i];
                next[i] = sx[i] + h / 2 * next[n + i];
            }
            for (r = 0; r < rows; r++)
                for (i = 0; i < n; i++) {
                    roln_real *const to = J + r * n2 + i;
                    to[n] += h * K[r * n + i];
                    to[0] = Xs[r * n2 + i] + h / 2 * to[n];
                }
        }
        for (j = 0; j < stages && scheme != ROLN_LEAPFROG; j++) {
            const roln_real b = rolni_stage_weight(scheme, j, h), c = rolni_stage_move(j, h);
            if ((st = rolni_stage(f, sys, 2, 1, j ? sx : s, k, tape, work)) != ROLN_OK) return st;
            rolni_stage_jac(f, sys, size, j > 0 ? Xs : NULL, K, tape, work);
            for (i = 0; i < n2; i++) {
                next[i] += b * k[i];
                sx[i] = s[i] + c * k[i];
            }
            for (r = 0; r < rows; r++)
                for (i = 0; i < n; i++) {
                    roln_real *x = Xs + r * n2 + i, *to = J + r * n2 + i;
                    to[0] += b * x[n];
                    to[n] += b * K[r * n + i];
                    x[0] = (r == i) + c * x[n];
                    x[n] = (r == n + i) + c * K[r * n + i];
                }
        }
        if (!roln_all_finite(n2, next)) return ROLN_E_NOT_FINITE;
        rolni_copy(n2, next, sn);
    }
    return ROLN_OK;
}

/* Stiction. roln_lnn_step without dry friction takes z, zd to z_f, v_f. Then an impulse lambda of dry friction acts,
       v+ = v_f - W lambda,   W = M^-1 at z_f,   low <= lambda <= high,
       v+_j >= 0 if lambda_j = high_j,   v+_j <= 0 if lambda_j = low_j,   else v+_j = 0: friction holds coordinate j.
   high and -low are h times the levels of the law forward and backward. lambda minimises 1/2 lambda^T W lambda - lambda^T v_f
   within the bounds, which is the change of the kinetic energy. The minimum is unique, since W is positive definite. */

#define ROLNI_STICK_ROUNDS 8 /* of the search for the coordinates that friction holds */
#define ROLNI_STICK_SWEEPS 2 /* of projected Gauss-Seidel in a round */

/* The bounds low, high [n] of row r of a tape at z_f. law: numbers of friction. zd [n]: the velocities at which the step begins.
   With law 2 the excess s (1 - Y^2) is that of zd, and the load |g| is that of z_f. */
ROLN_FN void rolni_stick_bounds(const roln_lnn *f, const roln_real *law, const rolni_tape *t, int r, roln_real h,
                                const roln_real *zd, roln_real *low, roln_real *high)
{
    const int n = f->n;
    int i;
    for (i = 0; i < n; i++) {
        if (f->friction < -1) {
            const rolni_law o = rolni_law_of(n, i, law, zd[i], t->g[r * n + i]);
            high[i] = h * (o.c * (1 + o.a) + o.s + o.l);
            low[i] = -h * (o.c * (1 - o.a) + o.s + o.l);
        } else {
            high[i] = h * roln_exp(law[i]);
            low[i] = -high[i];
        }
    }
}

/* 1 if friction holds a coordinate: its impulse is within the bounds. */
ROLNI_INLINE int rolni_sticks(roln_real low, roln_real high, roln_real lambda)
{
    return low < lambda && lambda < high;
}

/* mu [n] becomes the impulse of the held coordinates for which their v+ is 0, W_hh mu = v_h - W_hs lambda_s. The others keep
   lambda_s, and their mu is 0. A [n][n] becomes the Cholesky factor of W_hh, with rows of I for the others. Status of roln_chol. */
ROLN_FN roln_status rolni_stick_solve(int n, const roln_real *W, const roln_real *v, const roln_real *low, const roln_real *high,
                                      const roln_real *lambda, roln_real *A, roln_real *mu)
{
    roln_status st;
    int i, j;
    for (i = 0; i < n; i++) {
        const int held = rolni_sticks(low[i], high[i], lambda[i]);
        mu[i] = held ? v[i] : 0;
        for (j = 0; j < n; j++) {
            const int both = held && rolni_sticks(low[j], high[j], lambda[j]);
            A[i * n + j] = both ? W[i * n + j] : i == j;
            if (held && !both) mu[i] -= W[i * n + j] * lambda[j];
        }
    }
    if ((st = roln_chol(n, A, A)) != ROLN_OK) return st;
    roln_solve_lower(n, A, mu, mu);
    roln_solve_lower_t(n, A, mu, mu);
    return ROLN_OK;
}

/* The part of the way from lambda to mu at which a coordinate meets a bound; 2: it meets none. */
ROLNI_INLINE roln_real rolni_stick_way(roln_real low, roln_real high, roln_real lambda, roln_real mu)
{
    return mu >= high ? (high - lambda) / (mu - lambda) : mu <= low ? (low - lambda) / (mu - lambda) : 2;
}

/* lambda [n] for the velocity v [n] = v_f. Each round has a few sweeps of projected Gauss-Seidel. They find which coordinates are
   held. Then lambda moves towards the exact minimum over the held ones. A coordinate that meets its bound on the way stops there
   and slides, and the others go on. No part of a round lets the minimised sum grow, so the impulse takes kinetic energy even if the
   search is not at its end. A becomes the factor of rolni_stick_solve for the coordinates that are held in the end. mu [n]:
   scratch. */
ROLN_FN roln_status rolni_stick_impulse(int n, const roln_real *W, const roln_real *v, const roln_real *low, const roln_real *high,
                                        roln_real *lambda, roln_real *A, roln_real *mu)
{
    int round, k, i, met;
    rolni_zero(n, lambda);
    for (round = 0; round < ROLNI_STICK_ROUNDS; round++) {
        for (k = 0; k < ROLNI_STICK_SWEEPS * n; k++) {
            i = k % n;
            lambda[i] += (v[i] - roln_dot(n, W + i * n, lambda)) / W[i * (n + 1)];
            lambda[i] = lambda[i] > high[i] ? high[i] : lambda[i] < low[i] ? low[i] : lambda[i];
        }
        for (k = 0, met = 1; k < n && met; k++) {
            const roln_status st = rolni_stick_solve(n, W, v, low, high, lambda, A, mu);
            roln_real way = 1;
            if (st != ROLN_OK) return st;
            for (i = 0; i < n; i++) {
                const roln_real part = rolni_stick_way(low[i], high[i], lambda[i], mu[i]);
                if (rolni_sticks(low[i], high[i], lambda[i])) way = ROLN_MIN(way, part);
            }
            for (i = 0, met = 0; i < n; i++) {
                const int meets = rolni_stick_way(low[i], high[i], lambda[i], mu[i]) <= way;
                if (!rolni_sticks(low[i], high[i], lambda[i])) continue;
                if (meets) lambda[i] = mu[i] >= high[i] ? high[i] : low[i], met = 1;
                else lambda[i] = way < 1 ? lambda[i] + way * (mu[i] - lambda[i]) : mu[i];
            }
        }
    }
    return ROLN_OK;
}

/* The impulse of row r, on its state x [4][n] = z, zd, where the step begins, and z_f, v_f, which become z+, v+. The impulse counts
   half of the step for the position, z+ = z_f - h/2 W lambda. A held coordinate has z+_j = z_j + h/2 zd_j, so it stands if it stood
   before. With explicit Euler z+ = z_f. The arrays of the list stay in work for derivatives. */
#define ROLNI_STICK_MEM(X, n) X(W, (n) * (n)) X(A, (n) * (n)) X(low, n) X(high, n) X(lambda, n) X(mu, n)
#define ROLNI_STICK_WORK(n) (0 ROLNI_STICK_MEM(ROLNI_SIZE, n) + 2 * (n) * (n))
ROLN_FN roln_status rolni_stick(const roln_lnn *f, const roln_real *law, const rolni_tape *t, int r, int scheme, roln_real h,
                                roln_real *x, roln_real *work)
{
    const int n = f->n;
    const roln_real *const z = x, *const zd = z + n;
    roln_real *const zf = x + 2 * n, *const v = zf + n;
    roln_status st;
    int i;
    ROLNI_STICK_MEM(ROLNI_CARVE, n)
    rolni_minv_full(f, t, r, W, work);
    rolni_stick_bounds(f, law, t, r, h, zd, low, high);
    if (!roln_all_finite(2 * n, low)) return ROLN_E_NOT_FINITE; /* and high */
    if ((st = rolni_stick_impulse(n, W, v, low, high, lambda, A, mu)) != ROLN_OK) return st;
    for (i = 0; i < n; i++) {
        const int held = rolni_sticks(low[i], high[i], lambda[i]);
        const roln_real lost = roln_dot(n, W + i * n, lambda);
        if (scheme != ROLN_EULER) zf[i] = held ? z[i] + h / 2 * zd[i] : zf[i] - h / 2 * lost;
        v[i] = held ? 0 : v[i] - lost;
    }
    return ROLN_OK;
}

/* roln_lnn_step with stiction: f->friction is -1 or -2, and dry friction can hold coordinates. A held coordinate has v+ = 0
   exactly, and z+ = z if it stood before. The impulse never adds kinetic energy. Without driven coordinates. h >= 0; tape
   [ROLN_LNN_TAPE(S, 1, 0, nb)]; no backward follows. Status of roln_lnn_step; ROLN_E_RANGE also if h is negative; ROLN_E_NOT_FINITE
   also if a level is not finite; ROLN_E_NOT_SPD also if a block of M^-1 is not positive definite to working precision. sn may be s
   and is written only on ROLN_OK. step: ROLN_LNN_STEP_WORK(S, scheme, 0, nb). Cost: that of a step, of a mass matrix and of
   ROLNI_STICK_ROUNDS factors [n][n] or more, n times as many at most. */
#define ROLN_LNN_STICK_MEM(X, S, nb) X(next, 2 * (nb) * S(n)) X(x, 4 * S(n))
#define ROLN_LNN_STICK_WORK(S, step, nb) (0 ROLN_LNN_STICK_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(step, ROLNI_STICK_WORK(S(n))))
ROLN_FN roln_status roln_lnn_stick(const roln_lnn *f, const roln_system *sys, int scheme, int nb, roln_real h, const roln_real *s,
                                   roln_real *sn, roln_real *tape, roln_real *work)
{
    const int n = f->n, m = nb * n, wanted = f->friction < -1 ? ROLNI_GRADIENT : ROLNI_MASS;
    const rolni_tape t = rolni_tape_of(f, 1, 0, nb, tape);
    roln_status st;
    int r;
    ROLN_LNN_STICK_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    if (h < 0) return ROLN_E_RANGE;
    if ((st = roln_lnn_step(f, sys, scheme, 0, nb, h, s, next, tape, work)) != ROLN_OK) return st;
    if ((st = rolni_eval(f, 0, nb, sys->theta, next, NULL, wanted, tape, work)) != ROLN_OK) return st;
    for (r = 0; r < m; r += n) {
        rolni_copy(n, s + r, x);
        rolni_copy(n, s + m + r, x + n);
        rolni_copy(n, next + r, x + 2 * n);
        rolni_copy(n, next + m + r, x + 3 * n);
        st = rolni_stick(f, sys->theta + rolni_friction_at(f), &t, r / n, scheme, h, x, work);
        if (st != ROLN_OK) return st;
        rolni_copy(n, x + 2 * n, next + r);
        rolni_copy(n, x + 3 * n, next + m + r);
    }
    if (!roln_all_finite(2 * m, next)) return ROLN_E_NOT_FINITE;
    rolni_copy(2 * m, next, sn);
    return ROLN_OK;
}

/* How the impulse changes at fixed v_f. With K [n][n] and fall [n] the derivatives of v+ are those of v_f plus K W by z_f, and plus
   fall_j times row j of W by zd_j, before the held coordinates are held again:
       row k of K: DM[e_k] W lambda - d lambda / dz_k,   fall_j = -d lambda_j / dzd_j,   d lambda of sliding coordinates only.
   With law 2 lambda_j = +-h (.. + s (1 - Y^2) + l |g|), which gives the Hessian of V and the slope of Y^2. stick: the arrays that
   rolni_stick has left; t: a tape at z_f with keep, filled with ROLNI_SECOND if the law is 2. */
#define ROLNI_STICK_SLOPES_MEM(X, S) X(y, S(n)) X(H, S(n) * S(n)) X(in, S(n) * S(cossin))
#define ROLNI_STICK_SLOPES_WORK(S) \
    (0 ROLNI_STICK_SLOPES_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(ROLNI_MOMENTUM_JAC_WORK(S), (ROLNI_LAW(S(friction)) > 2) * ROLNI_CURVATURE_WORK(S, 1)))
ROLN_FN void rolni_stick_slopes(const roln_lnn *f, const roln_real *theta, const rolni_tape *t, roln_real h, const roln_real *zd,
                                roln_real *stick, roln_real *K, roln_real *fall, roln_real *work)
{
    const int n = f->n, cossin = rolni_cossin(f);
    const roln_real *const law = theta + rolni_friction_at(f);
    const roln_real *const W = stick, *const low = W + 2 * n * n, *const high = low + n, *const lambda = high + n;
    int i, j;
    ROLNI_STICK_SLOPES_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    for (i = 0; i < n; i++)
        y[i] = roln_dot(n, W + i * n, lambda);
    rolni_momentum_jac(f, theta, t, y, K, work);
    rolni_zero(n, fall);
    if (f->friction == -1) return;
    rolni_zero(n * n, H);
    if (f->angles) rolni_see_all(f, 1, t, in);
    rolni_curvature(f, 1, 1, theta, t, f->angles ? in : NULL, NULL, H, work);
    for (j = 0; j < n; j++) {
        const rolni_law o = rolni_law_of(n, j, law, zd[j], t->g[j]);
        const roln_real way = lambda[j] >= high[j] ? h : lambda[j] <= low[j] ? -h : 0;
        const roln_real load = way * roln_exp(law[4 * n + j]) * o.sign;
        for (i = 0; i < n; i++)
            K[i * n + j] -= load * H[i * n + j];
        fall[j] = way * 2 * o.s * o.Y * roln_exp(-law[3 * n + j]);
    }
}

/* roln_lnn_stick of one state, the same bits, and its derivatives, in which the coordinates H stay held: J as roln_lnn_step_jac.
   With a row dz, dv of the step without dry friction
       b = dv + dz K W + ..,   dv+ = b - W_H W_HH^-1 b_H,   dz+ = dz - h/2 (dv - dv+),   with Euler dz+ = dz.
   In H dv+ is 0 and z+_j = z_j + h/2 zd_j. tape: that of roln_lnn_step_jac. step: ROLN_LNN_STEP_JAC_WORK(S, scheme, size). Status
   of roln_lnn_stick and of roln_lnn_step_jac. sn is written only on ROLN_OK, and only then is J of use. */
#define ROLN_LNN_STICK_JAC_MEM(X, S) \
    X(next, 2 * S(n)) X(x, 4 * S(n)) X(K, S(n) * S(n)) X(fall, S(n)) X(b, S(n)) X(c, S(n))
#define ROLN_LNN_STICK_JAC_WORK(S, step) \
    (0 ROLN_LNN_STICK_JAC_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(step, ROLN_MAX(ROLNI_STICK_WORK(S(n)), (0 ROLNI_STICK_MEM(ROLNI_SIZE, S(n))) + S(stick_slopes))))
ROLN_FN roln_status roln_lnn_stick_jac(const roln_lnn *f, const roln_system *sys, int scheme, int size, roln_real h,
                                       const roln_real *s, roln_real *sn, roln_real *J, roln_real *tape, roln_real *work)
{
    const int n = f->n, n2 = 2 * n, wanted = f->friction < -1 ? ROLNI_SECOND : ROLNI_MASS;
    const rolni_tape t = rolni_tape_of(f, 1, 1, 1, tape);
    roln_status st;
    roln_real *stick;
    int i, r;
    ROLN_LNN_STICK_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    stick = work;
    if (h < 0) return ROLN_E_RANGE;
    if ((st = roln_lnn_step_jac(f, sys, scheme, size, h, s, next, J, tape, work)) != ROLN_OK) return st;
    if ((st = rolni_eval(f, 1, 1, sys->theta, next, NULL, wanted, tape, work)) != ROLN_OK) return st;
    rolni_copy(n2, s, x);
    rolni_copy(n2, next, x + n2);
    if ((st = rolni_stick(f, sys->theta + rolni_friction_at(f), &t, 0, scheme, h, x, stick)) != ROLN_OK) return st;
    if (!roln_all_finite(n2, x + n2)) return ROLN_E_NOT_FINITE;
    {
        ROLNI_STICK_MEM(ROLNI_CARVE, n)
        rolni_stick_slopes(f, sys->theta, &t, h, x + n, stick, K, fall, work);
        for (r = 0; r < n2 + size; r++) {
            roln_real *const dz = J + r * n2, *const dv = dz + n;
            roln_mm(1, n, n, dz, K, c);
            if (r >= n && r < n2) c[r - n] += fall[r - n];
            roln_mm(1, n, n, c, W, b);
            for (i = 0; i < n; i++) {
                b[i] += dv[i];
                mu[i] = rolni_sticks(low[i], high[i], lambda[i]) ? b[i] : 0;
            }
            roln_solve_lower(n, A, mu, mu);
            roln_solve_lower_t(n, A, mu, mu);
            for (i = 0; i < n; i++) {
                const int held = rolni_sticks(low[i], high[i], lambda[i]);
                const roln_real now = held ? 0 : b[i] - roln_dot(n, W + i * n, mu);
                if (scheme != ROLN_EULER) dz[i] = held ? (r == i) + (r == n + i) * (h / 2) : dz[i] - h / 2 * (dv[i] - now);
                dv[i] = now;
            }
        }
    }
    rolni_copy(n2, x + n2, sn);
    return ROLN_OK;
}

/* The start of a motion known by positions only: s1 = [z1; zd1] from z0, z1 [nb][n] a step h apart (an angle turns by less than pi
   between them, whatever their turns), by the discrete Legendre
   transform of the variational midpoint rule,
       M(z1) zd1 = M(z_m) v + h/2 F(z_m, v),   z_m = (z0 + z1)/2,  v = (z1 - z0)/h.
   roln_lnn_step with ROLN_MIDPOINT goes on from there, so that three successive positions satisfy the discrete Euler-Lagrange
   equations. keep: 1 if roln_lnn_start_bwd is to follow, else 0. tape: two [ROLN_LNN_TAPE(S, 1, 1, nb)] with keep, one
   [ROLN_LNN_TAPE(S, 1, 0, nb)] without. Status of roln_lnn_zdd; s1 is written only on ROLN_OK. */
#define ROLN_LNN_START_MEM(X, S, nb) X(sm, 2 * (nb) * S(n)) X(p, (nb) * S(n)) X(F, (nb) * S(n))
#define ROLN_LNN_START_WORK(S, keep, nb) \
    (0 ROLN_LNN_START_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(ROLNI_EVAL_WORK(S, 1, keep, ROLNI_GRADIENT, nb), S(n)))
ROLN_FN roln_status roln_lnn_start(const roln_lnn *f, const roln_system *sys, int keep, int nb, roln_real h, const roln_real *z0,
                                   const roln_real *z1, roln_real *s1, roln_real *tape, roln_real *work)
{
    const int n = f->n, m = nb * n, stride = keep ? roln_lnn_tape(f, 1, 1, nb) : 0;
    const rolni_tape tm = rolni_tape_of(f, 1, keep, nb, tape), t1 = rolni_tape_of(f, 1, keep, nb, tape + stride);
    roln_status st;
    int i;
    ROLN_LNN_START_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    for (i = 0; i < m; i++) {
        const roln_real from = roln_lnn_near(f, i % n, z1[i], z0[i]);
        sm[i] = (from + z1[i]) / 2;
        sm[m + i] = (z1[i] - from) / h;
    }
    if ((st = rolni_impulse(f, sys, keep, nb, sm, F, tape, work)) != ROLN_OK) return st;
    rolni_mul_all(f, nb, &tm, sm + m, p, work);
    for (i = 0; i < m; i++) {
        p[i] += h / 2 * F[i];
        sm[i] = z1[i];
    }
    if ((st = rolni_eval(f, keep, nb, sys->theta, sm, NULL, ROLNI_MASS, tape + stride, work)) != ROLN_OK) return st;
    rolni_minv_all(f, nb, &t1, p, t1.zdd, work);
    if (!roln_all_finite(m, t1.zdd)) return ROLN_E_NOT_FINITE;
    rolni_copy(m, sm, s1);
    rolni_copy(m, t1.zdd, s1 + m);
    return ROLN_OK;
}

/* Backward of roln_lnn_start through its tapes: gs1 [2][nb][n] in; adds to gz0, gz1 [nb][n], gtheta (may be NULL) and, through
   force->bwd, to what the force depends on. */
#define ROLN_LNN_START_BWD_MEM(X, S, nb) X(gp, (nb) * S(n)) X(a, (nb) * S(n)) X(gm, (nb) * S(n)) X(gv, (nb) * S(n))
#define ROLN_LNN_START_BWD_WORK(S, nb) \
    (0 ROLN_LNN_START_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_MAX(ROLNI_ADJOINT_WORK(S, 1, nb), (nb) * S(n) + S(n)))
ROLN_FN void roln_lnn_start_bwd(const roln_lnn *f, const roln_system *sys, int nb, roln_real h, const roln_real *gs1,
                                roln_real *gz0, roln_real *gz1, roln_real *gtheta, roln_real *tape, roln_real *work)
{
    const int n = f->n, m = nb * n, stride = roln_lnn_tape(f, 1, 1, nb);
    const rolni_tape tm = rolni_tape_of(f, 1, 1, nb, tape), t1 = rolni_tape_of(f, 1, 1, nb, tape + stride);
    int i;
    ROLN_LNN_START_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    const rolni_pair first = {1, gp, tm.zd, NULL, NULL}, last = {-1, gp, t1.zdd, NULL, NULL};
    rolni_minv_all(f, nb, &t1, gs1 + m, gp, work);
    rolni_momentum_bwd(f, nb, sys->theta, &last, gz1, gtheta, tape + stride, work);
    for (i = 0; i < m; i++)
        a[i] = h / 2 * gp[i];
    rolni_zero(m, gm), rolni_zero(m, gv);
    rolni_impulse_bwd(f, nb, sys->theta, &first, a, gm, gv, gtheta, tape, work);
    if (sys->force) sys->force->bwd(sys->force->ctx, nb, tm.x, a, 1, gm);
    rolni_mul_all(f, nb, &tm, gp, work, work + m);
    for (i = 0; i < m; i++) {
        const roln_real v = (gv[i] + work[i]) / h, z = gm[i] / 2;
        gz0[i] += z - v;
        gz1[i] += gs1[i] + z + v;
    }
}

#endif
