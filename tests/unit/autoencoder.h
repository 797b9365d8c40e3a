/* SPDX-License-Identifier: MIT */
/* autoencoder.h - what the tests of roln_ae.h share: twins in long double of encoder, decoder and forces with full Jacobians; the
   library in either direction; shapes and random weights; checks that weights of every storage have to pass. Include after
   roln_ae.h. */
#ifndef AUTOENCODER_H
#define AUTOENCODER_H

#include "twin.h"
#include "room.h"
#include "curves.h"

#define SLOPE ROLN_C(0.41421356)
#define STRAIGHT .storage = ROLN_FULL, .bend = ROLN_UNBENT
#define BENT(n, d) .storage = ROLN_FULL, .bend = &roln_polynomial, .degree = d, .monomials = ROLN_MONOMIALS(n, d)
#define NOISE (1.5e-14L / EPS) /* rounding of the differences of the twins */
#define AMP(ae) ((ae).monomials > 0 ? 0.4 : 0.7) /* of states: the polynomials are made for [-1, 1] */
#define MAXW 12    /* widest layer that the twin takes */
#define MAXP 1000  /* most parameters */
#define MAXB 40    /* most rows of a block */

/* A shape and all that its losses read. */
typedef struct {
    roln_ae ae;
    int enc, jets, nb;
    ld th[MAXP], in[MAXB * MAXW], tau[MAXB * MAXW], g[MAXB * MAXW];
} model;

static model m;

/* The sizes that the size macros of roln_ae.h ask for, of m. */
typedef struct {
    int N, n, N1, N2, ae_sum, monomials, bent, ae_size, keeps;
} sizes;

ROLN_FN sizes sizes_of_m(void)
{
    const roln_ae *ae = &m.ae;
    const sizes s = {ae->size[0], ae->size[ae->layers], roln_ae_width(ae, 1), roln_ae_width(ae, 2),
                     roln_ae_sum(ae), ae->monomials, roln_ae_bent(ae), roln_ae_params(ae), ae->keeps};
    return s;
}
#define OF_M(name) sizes_of_m().name

ROLN_FN int tape_size(int enc, int jets, int nb)
{
    return enc ? ROLN_AE_ENCODE_TAPE(OF_M, jets, nb) : ROLN_AE_DECODE_TAPE(OF_M, jets, nb);
}

ROLN_FN int bwd_size(int enc, int jets, int nb)
{
    return enc ? ROLN_AE_ENCODE_BWD_WORK(OF_M, jets, nb) : ROLN_AE_DECODE_BWD_WORK(OF_M, jets, nb);
}

/* ---- twins ---- */

/* s[0..3] = value and derivatives of the activation. The published form, a = csc^2 - sec^2, b = csc^2 + sec^2 of alpha:
   b/a x +- sqrt2/(a sin) -+ 1/a sqrt(Z^2 + 2a), Z = 2x/(sin cos) +- sqrt2/cos, with the difference of the last two
   terms as a quotient where it cancels. */
ROLN_FN void t_act(ld k, ld sg, ld x, ld s[4])
{
    const ld alpha = atanl(1) - atanl(k), si = sinl(alpha), co = cosl(alpha), r2 = sqrtl(2);
    const ld a = 1 / (si * si) - 1 / (co * co), b = 1 / (si * si) + 1 / (co * co), d = 2 / (si * co);
    const ld Z = d * x + sg * r2 / co, R = sqrtl(Z * Z + 2 * a);
    if (k == 1) {
        s[0] = x, s[1] = 1, s[2] = s[3] = 0;
        return;
    }
    if (fabsl(x) > 0.01L) s[0] = b / a * x + sg * (r2 / (a * si) - R / a);
    else s[0] = x * (b / a - sg / a * d * (d * x + sg * 2 * r2 / co) / (R + r2 / si));
    s[1] = b / a - sg / a * d * Z / R;
    s[2] = -sg / a * d * d * 2 * a / (R * R * R);
    s[3] = 3 * sg / a * d * d * d * 2 * a * Z / (R * R * R * R * R);
}

/* A point on its way through the layers: y, its Jacobian J [rows][d] with respect to the first, and the rate of J along v. */
typedef struct {
    int d;
    const ld *v;
    ld *y, *J, *Jd;
} point;

/* The rate of number i of y. */
ROLN_FN ld t_rate(const point *q, int i)
{
    ld sum = 0;
    int k;
    for (k = 0; k < q->d; k++) sum += q->J[i * q->d + k] * q->v[k];
    return sum;
}

/* y = x [out], a function of the y that was [in], with the derivative G [out][in] and its rate Gd (NULL: 0) */
ROLN_FN void t_chain(point *q, int out, int in, const ld *x, const ld *G, const ld *Gd)
{
    static ld T[MAXW * MAXW], Td[MAXW * MAXW];
    const int d = q->d;
    int i, j, k;
    for (i = 0; i < out; i++)
        for (k = 0; k < d; k++)
            for (T[i * d + k] = Td[i * d + k] = 0, j = 0; j < in; j++) {
                T[i * d + k] += G[i * in + j] * q->J[j * d + k];
                Td[i * d + k] += G[i * in + j] * q->Jd[j * d + k] + (Gd ? Gd[i * in + j] * q->J[j * d + k] : 0);
            }
    for (i = 0; i < out; i++) q->y[i] = x[i];
    for (i = 0; i < out * d; i++) q->J[i] = T[i], q->Jd[i] = Td[i];
}

/* Psi^T (y - b) (enc) or Phi y + b of a layer N -> n. */
ROLN_FN void t_linear(point *q, int enc, int N, int n, const ld *layer)
{
    static ld G[MAXW * MAXW], x[MAXW];
    const ld *phi = layer, *psi = phi + n * N, *b = psi + n * N;
    const int out = enc ? n : N, in = enc ? N : n;
    int i, j;
    for (i = 0; i < out; i++)
        for (x[i] = enc ? 0 : b[i], j = 0; j < in; j++) {
            G[i * in + j] = enc ? psi[i * N + j] : phi[j * N + i];
            x[i] += G[i * in + j] * (q->y[j] - (enc ? b[j] : 0));
        }
    t_chain(q, out, in, x, G, NULL);
}

ROLN_FN void t_activation(point *q, int enc, int n, ld slope)
{
    int i, k;
    for (i = 0; i < n; i++) {
        const ld yd = t_rate(q, i);
        ld s[4], *J = q->J + i * q->d, *Jd = q->Jd + i * q->d;
        t_act(slope, enc ? 1 : -1, q->y[i], s);
        for (k = 0; k < q->d; k++) Jd[k] = s[1] * Jd[k] + s[2] * yd * J[k], J[k] *= s[1];
        q->y[i] = s[0];
    }
}

ROLN_FN void t_bent(point *q, int N, int n, int degree, const ld *layer)
{
    static ld x[MAXW], G[MAXW * MAXW], Gd[MAXW * MAXW], yd[MAXW];
    int i;
    for (i = 0; i < n; i++) yd[i] = t_rate(q, i);
    t_bend(N, n, degree, layer, q->y, yd, x, G, Gd);
    t_chain(q, N, n, x, G, Gd);
}

/* y = rho(x) (enc) or phi(x), its Jacobian J [out][in] and the rate of J along v. */
ROLN_FN void t_map(const roln_ae *ae, int enc, const ld *th, const ld *x, const ld *v, ld *y, ld *J, ld *Jd)
{
    const int L = ae->layers, d = ae->size[enc ? 0 : L];
    point q;
    int step, l, i;
    q.d = d, q.v = v, q.y = y, q.J = J, q.Jd = Jd;
    for (i = 0; i < d; i++) y[i] = x[i];
    for (i = 0; i < d * d; i++) J[i] = i % (d + 1) == 0, Jd[i] = 0;
    for (step = 0; step < L; step++) {
        const int layer = enc ? step : L - 1 - step, N = ae->size[layer], n = ae->size[layer + 1];
        const int bent = ae->monomials > 0 && layer == L - 1;
        const ld *w = th;
        for (l = 0; l < layer; l++) w += 2 * ae->size[l] * ae->size[l + 1] + ae->size[l];
        if (enc) t_linear(&q, 1, N, n, w);
        if (!bent) t_activation(&q, enc, n, (ld)ae->slope);
        if (!enc && !bent) t_linear(&q, 0, N, n, w);
        if (!enc && bent) t_bent(&q, N, n, ae->degree, w);
    }
}

/* All planes of the block of m. */
ROLN_FN void t_jets(const ld *in, ld *out)
{
    static ld pos[MAXW], J[MAXW * MAXW], Jd[MAXW * MAXW], zero[MAXW];
    const int d = m.ae.size[m.enc ? 0 : m.ae.layers], o = m.ae.size[m.enc ? m.ae.layers : 0];
    int r, i, k;
    for (r = 0; r < m.nb; r++) {
        const ld *x = in + r * d, *xd = m.jets > 1 ? in + (m.nb + r) * d : zero, *xdd = in + (2 * m.nb + r) * d;
        t_map(&m.ae, m.enc, m.th, x, xd, pos, J, Jd);
        for (i = 0; i < o; i++) {
            ld y = 0, yy = 0;
            out[r * o + i] = pos[i];
            for (k = 0; k < d && m.jets > 1; k++) y += J[i * d + k] * xd[k];
            for (k = 0; k < d && m.jets > 2; k++) yy += J[i * d + k] * xdd[k] + Jd[i * d + k] * xd[k];
            if (m.jets > 1) out[(m.nb + r) * o + i] = y;
            if (m.jets > 2) out[(2 * m.nb + r) * o + i] = yy;
        }
    }
}

ROLN_FN ld t_loss(void *ctx)
{
    static ld out[MAXB * MAXW];
    const int o = m.jets * m.nb * m.ae.size[m.enc ? m.ae.layers : 0];
    ld s = 0;
    int i;
    (void)ctx;
    t_jets(m.in, out);
    for (i = 0; i < o; i++) s += m.g[i] * out[i];
    return s;
}

/* Pulled back forces, J^T tau of the decoder or D^T tau_z of the encoder. */
ROLN_FN void t_force(ld *f)
{
    static ld y[MAXW], J[MAXW * MAXW], Jd[MAXW * MAXW], zero[MAXW];
    const int d = m.ae.size[m.enc ? 0 : m.ae.layers], o = m.ae.size[m.enc ? m.ae.layers : 0];
    int r, i, k;
    for (r = 0; r < m.nb; r++) {
        t_map(&m.ae, m.enc, m.th, m.in + r * d, zero, y, J, Jd);
        for (k = 0; k < d; k++)
            for (f[r * d + k] = 0, i = 0; i < o; i++) f[r * d + k] += J[i * d + k] * m.tau[r * o + i];
    }
}

ROLN_FN ld t_force_loss(void *ctx)
{
    static ld f[MAXB * MAXW];
    ld s = 0;
    int i;
    (void)ctx;
    t_force(f);
    for (i = 0; i < m.nb * m.ae.size[m.enc ? 0 : m.ae.layers]; i++) s += m.g[i] * f[i];
    return s;
}

/* One coordinate of a curve through the twin, for its derivatives in time. */
static ld curve_t, curve_x[MAXW], curve_v[MAXW], curve_a[MAXW];
static int curve_i;
ROLN_FN ld t_curve(void *ctx)
{
    static ld x[MAXW], v[MAXW], y[MAXW], J[MAXW * MAXW], Jd[MAXW * MAXW];
    const int d = m.ae.size[m.enc ? 0 : m.ae.layers];
    ld yd = 0;
    int i;
    for (i = 0; i < d; i++) {
        x[i] = curve_x[i] + curve_t * (curve_v[i] + curve_t / 2 * curve_a[i]);
        v[i] = curve_v[i] + curve_t * curve_a[i];
    }
    t_map(&m.ae, m.enc, m.th, x, v, y, J, Jd);
    for (i = 0; i < d; i++) yd += J[curve_i * d + i] * v[i];
    return ctx ? yd : y[curve_i];
}

/* ---- the library, either direction ---- */

ROLN_FN int dim_in(void) { return m.ae.size[m.enc ? 0 : m.ae.layers]; }
ROLN_FN int dim_out(void) { return m.ae.size[m.enc ? m.ae.layers : 0]; }

ROLN_FN void run(int nb, const roln_real *th, const roln_real *in, roln_real *out, roln_real *tape)
{
    (m.enc ? roln_ae_encode : roln_ae_decode)(&m.ae, m.jets, nb, th, in, out, tape);
}

ROLN_FN void run_bwd(const roln_real *th, const roln_real *tape, const roln_real *g, roln_real *gin, roln_real *gth, roln_real *w)
{
    (m.enc ? roln_ae_encode_bwd : roln_ae_decode_bwd)(&m.ae, m.jets, m.nb, th, tape, g, gin, gth, w);
}

/* Biorthogonal weights with random biases; of a square layer Psi = 2 H, Phi = H / 2, H a reflection. */
ROLN_FN roln_real *weights(uint64_t *s)
{
    const int p = roln_ae_params(&m.ae);
    roln_real *th = fresh(p), *t = th, *w = fresh(ROLN_AE_INIT_WORK(OF_M));
    roln_real best = 0, top;
    uint64_t draw = 0, seed;
    int l, i;
    for (l = 0; l < 20; l++) { /* of 20 draws the best conditioned, that of the smallest Phi */
        seed = *s + (uint64_t)l;
        CHECK(roln_ae_init(&m.ae, th, &seed, w) == ROLN_OK);
        for (top = 0, i = 0; i < p; i++) top = ROLN_ABS(th[i]) > top ? ROLN_ABS(th[i]) : top;
        if (l == 0 || top < best) best = top, draw = *s + (uint64_t)l;
    }
    *s = draw;
    CHECK(roln_ae_init(&m.ae, th, s, w) == ROLN_OK);
    for (l = 0; l < m.ae.layers; l++) {
        const int N = m.ae.size[l], n = m.ae.size[l + 1];
        roln_real v[MAXW], vv = 0;
        for (i = 0; i < n && n == N; i++) v[i] = roln_normal(s), vv += v[i] * v[i];
        for (i = 0; i < n * n && n == N; i++) {
            const roln_real h = (roln_real)(i % (n + 1) == 0) - 2 * v[i / n] * v[i % n] / vv;
            t[i] = h / 2, t[n * n + i] = 2 * h;
        }
        t += 2 * N * n;
        for (i = 0; i < m.ae.size[l]; i++) *t++ = ROLN_C(0.3) * roln_normal(s);
    }
    for (i = 0; i < m.ae.monomials * roln_ae_bent(&m.ae); i++) {
        CHECK(*t == 0); /* W */
        *t++ = ROLN_C(0.3) * roln_normal(s);
    }
    CHECK(t == th + p);
    if (p <= MAXP) widen(p, th, m.th);
    return th;
}

/* ---- shapes ---- */

/* Every width and depth that the twins differentiate, with and without layers that keep their size; then shapes whose last layer is
   bent. */
enum { SHAPES = 8, BENT_SHAPES = 7 };
static const roln_ae shapes[SHAPES] = {
    {.layers = 0, .size = {3}, .slope = SLOPE, STRAIGHT},
    {.layers = 1, .size = {4, 2}, .slope = SLOPE, STRAIGHT},
    {.layers = 1, .size = {2, 1}, .slope = ROLN_C(0.2), STRAIGHT},
    {.layers = 2, .size = {6, 4, 3}, .slope = ROLN_C(0.50952545), STRAIGHT},
    {.layers = 3, .size = {7, 5, 4, 2}, .slope = SLOPE, STRAIGHT},
    {.layers = 2, .size = {5, 3, 1}, .slope = 1, STRAIGHT},
    {.layers = 3, .size = {5, 4, 3, 3}, .slope = SLOPE, STRAIGHT},
    {.layers = 4, .size = {9, 8, 4, 3, 1}, .slope = SLOPE, STRAIGHT},
};
static const roln_ae bent[BENT_SHAPES] = {
    {.layers = 1, .size = {3, 1}, .slope = 1, BENT(1, 8)},
    {.layers = 1, .size = {4, 2}, .slope = SLOPE, BENT(2, 3)},
    {.layers = 1, .size = {7, 3}, .slope = SLOPE, BENT(3, 4)},
    {.layers = 1, .size = {6, 5}, .slope = SLOPE, BENT(5, 2)},
    {.layers = 2, .size = {6, 4, 2}, .slope = SLOPE, BENT(2, 4)},
    {.layers = 2, .size = {7, 5, 3}, .slope = 1, BENT(3, 2)},
    {.layers = 3, .size = {5, 5, 4, 2}, .slope = ROLN_C(0.50952545), BENT(2, 5)},
};

/* ---- shared checks ---- */

/* The force map of m at in: lift (enc) or reduce. */
ROLN_FN void run_force(const roln_real *th, const roln_real *in, const roln_real *tau, roln_real *f)
{
    roln_real *tape = fresh(tape_size(m.enc, 1, m.nb)), *out = fresh(m.nb * dim_out());
    roln_real *at_x = fresh(ROLN_AE_LIFT_TAPE(OF_M, m.nb)), *w = fresh(ROLN_AE_LIFT_WORK(OF_M, m.nb));
    run(m.nb, th, in, out, tape);
    roln_ae_lift_tape(&m.ae, 1, m.nb, tape, at_x);
    if (m.enc) roln_ae_lift(&m.ae, m.nb, th, at_x, tau, f, w);
    else roln_ae_reduce(&m.ae, m.nb, th, tape, tau, f, fresh(ROLN_AE_REDUCE_WORK(OF_M, m.nb)));
}

/* All derivatives of reduce at one point, in a random direction y of tau_z, against differences; all of its scratch is written. */
ROLN_FN void check_reduce_jac(roln_ae ae, const roln_real *th, ld bound, uint64_t *s)
{
    const int N = ae.size[0], n = ae.size[ae.layers];
    roln_real *in = normal(n, AMP(ae), s), *tau = normal(N, 1, s), *y = normal(n, 1, s), *T = fresh(n * N), *H = fresh(n * n);
    roln_real *gin = zeros(n), *gtau = zeros(N);
    int i, j;
    m.ae = ae, m.enc = 0, m.jets = 1, m.nb = 1;
    widen(n, in, m.in), widen(N, tau, m.tau), widen(n, y, m.g);
    roln_ae_reduce_jac(&ae, th, in, tau, T, H, fresh(ROLN_AE_REDUCE_JAC_WORK(OF_M)));
    for (j = 0; j < n; j++) {
        for (i = 0; i < n; i++) gin[i] += y[j] * H[j * n + i];
        for (i = 0; i < N; i++) gtau[i] += y[j] * T[j * N + i];
    }
    BOUND("reduce: derivatives by the point (eps)", t_gradient(n, gin, m.in, 2e-4L, t_force_loss, NULL) / EPS, bound + 2 * NOISE);
    BOUND("reduce: derivatives by the force (eps)", t_gradient(N, gtau, m.tau, 2e-4L, t_force_loss, NULL) / EPS, bound + NOISE);
    roln_ae_reduce_jac(&ae, th, in, tau, T, H, room_of(ROLN_AE_REDUCE_JAC_WORK(OF_M)));
    CHECK_ROOM();
}

/* Every tape and every scratch is as large as its macro says, no more and no less. */
ROLN_FN void check_rooms(roln_ae ae, int jets, int nb, uint64_t *s)
{
    const int N = ae.size[0], n = ae.size[ae.layers], full = ae.storage == ROLN_FULL, p = roln_ae_params(&ae);
    roln_real *th, *x, *z, *y, *g, *gth, *tape;
    m.ae = ae;
    m.ae.storage = ROLN_FULL;
    th = weights(s);
    m.ae = ae;
#ifndef ROLN_DOUBLE
    if (!full) {
        roln_real lo[MAXW * 4], hi[MAXW * 4], *stored = fresh(p);
        int i;
        for (i = 0; i < n; i++) lo[i] = -1, hi[i] = 1;
        CHECK(roln_ae_quantise(&ae, th, lo, hi, stored, room_of(ROLN_AE_QUANTISE_WORK(OF_M))) == ROLN_OK);
        CHECK_ROOM();
        th = stored;
    }
#endif
    x = normal(jets * nb * N, 0.7, s), z = normal(jets * nb * n, 0.7, s), y = zeros(jets * nb * N), g = zeros(jets * nb * N);
    gth = full ? zeros(p) : NULL;

    tape = fresh(tape_size(1, jets, nb));
    roln_ae_encode(&ae, jets, nb, th, x, g, room_of(tape_size(1, jets, nb))), CHECK_ROOM();
    roln_ae_encode(&ae, jets, nb, th, x, g, tape);
    roln_ae_encode_bwd(&ae, jets, nb, th, tape, z, g, gth, room_of(bwd_size(1, jets, nb))), CHECK_ROOM();

    tape = fresh(tape_size(0, jets, nb));
    roln_ae_decode(&ae, jets, nb, th, z, y, room_of(tape_size(0, jets, nb))), CHECK_ROOM();
    roln_ae_decode(&ae, jets, nb, th, z, y, tape);
    roln_ae_decode_bwd(&ae, jets, nb, th, tape, x, g, gth, room_of(bwd_size(0, jets, nb))), CHECK_ROOM();

    roln_ae_lift_tape(&ae, jets, nb, tape, room_of(ROLN_AE_LIFT_TAPE(OF_M, nb))), CHECK_ROOM();
    roln_ae_lift_tape(&ae, jets, nb, tape, tape);
    roln_ae_lift(&ae, nb, th, tape, z, y, room_of(ROLN_AE_LIFT_WORK(OF_M, nb))), CHECK_ROOM();
    roln_ae_decode(&ae, 1, nb, th, z, NULL, tape);
    roln_ae_reduce(&ae, nb, th, tape, x, y, room_of(ROLN_AE_REDUCE_WORK(OF_M, nb))), CHECK_ROOM();
    roln_ae_reduce_bwd(&ae, nb, th, z, x, z, g, y, gth, room_of(ROLN_AE_REDUCE_BWD_WORK(OF_M, nb))), CHECK_ROOM();
    if (full) {
        const int sums = ROLN_AE_POD_ROOM(OF_M);
        CHECK(roln_ae_init(&ae, gth, s, room_of(ROLN_AE_INIT_WORK(OF_M))) == ROLN_OK), CHECK_ROOM();
        x = normal(2 * N * N, 1, s);
        CHECK(roln_ae_init_pod(&ae, 2 * N, x, 1, NULL, gth, area_of(sums), room_of(ROLN_AE_POD_WORK(OF_M))) == ROLN_OK);
        CHECK_ROOM(), CHECK_AREA(sums);
    }
    fresh_done();
}

#endif
