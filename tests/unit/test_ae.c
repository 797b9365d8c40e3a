/* SPDX-License-Identifier: MIT */
/* Constrained autoencoder (roln_ae.h) against twins in long double: the activation in its published form (Otto, Macchio,
   Rowley 2023), encoder and decoder with full Jacobians, and central differences of the twins for every backward. */
#include "roln_ae.h"
#include "twin.h"
#include "room.h"
#include "curves.h"

void TEST_NAME(ae)(void);

#define SLOPE ROLN_C(0.41421356)
#define STRAIGHT ROLN_FULL, ROLN_UNBENT, 0, 0
#define BENT(n, d) ROLN_FULL, &roln_polynomial, d, ROLN_CURVES(n, d)
#define NOISE (1.5e-14L / EPS) /* rounding of the differences of the twins */
#define AMP(ae) ((ae).curves > 0 ? 0.4 : 0.7) /* of states: the polynomials are made for [-1, 1] */
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
    int N, n, N1, N2, ae_sum, curves, bent, ae_size;
} sizes;

static sizes sizes_of_m(void)
{
    const roln_ae *ae = &m.ae;
    const sizes s = {ae->size[0], ae->size[ae->layers], roln_ae_size(ae, 1), roln_ae_size(ae, 2),
                     roln_ae_sum(ae), ae->curves, roln_ae_bent(ae), roln_ae_params(ae)};
    return s;
}
#define OF_M(name) sizes_of_m().name

static int some_size(int jets, int nb)
{
    return ROLN_AE_DECODE_SOME_TAPE(OF_M, jets, nb);
}

static int tape_size(int enc, int jets, int nb)
{
    return enc ? ROLN_AE_ENCODE_TAPE(OF_M, jets, nb) : ROLN_AE_DECODE_TAPE(OF_M, jets, nb);
}

static int bwd_size(int enc, int jets, int nb)
{
    return enc ? ROLN_AE_ENCODE_BWD_WORK(OF_M, jets, nb) : ROLN_AE_DECODE_BWD_WORK(OF_M, jets, nb);
}

/* ---- twins ---- */

/* s[0..3] = value and derivatives of the activation. The published form, a = csc^2 - sec^2, b = csc^2 + sec^2 of alpha:
   b/a x +- sqrt2/(a sin) -+ 1/a sqrt(Z^2 + 2a), Z = 2x/(sin cos) +- sqrt2/cos, with the difference of the last two
   terms as a quotient where it cancels. */
static void t_act(ld k, ld sg, ld x, ld s[4])
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
static ld t_rate(const point *q, int i)
{
    ld sum = 0;
    int k;
    for (k = 0; k < q->d; k++) sum += q->J[i * q->d + k] * q->v[k];
    return sum;
}

/* y = x [out], a function of the y that was [in], with the derivative G [out][in] and its rate Gd (NULL: 0) */
static void t_chain(point *q, int out, int in, const ld *x, const ld *G, const ld *Gd)
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
static void t_linear(point *q, int enc, int N, int n, const ld *layer)
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

static void t_activation(point *q, int enc, int n, ld slope)
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

static void t_bent(point *q, int N, int n, int degree, const ld *layer)
{
    static ld x[MAXW], G[MAXW * MAXW], Gd[MAXW * MAXW], yd[MAXW];
    int i;
    for (i = 0; i < n; i++) yd[i] = t_rate(q, i);
    t_bend(N, n, degree, layer, q->y, yd, x, G, Gd);
    t_chain(q, N, n, x, G, Gd);
}

/* y = rho(x) (enc) or phi(x), its Jacobian J [out][in] and the rate of J along v. */
static void t_map(const roln_ae *ae, int enc, const ld *th, const ld *x, const ld *v, ld *y, ld *J, ld *Jd)
{
    const int L = ae->layers, d = ae->size[enc ? 0 : L];
    point q;
    int step, l, i;
    q.d = d, q.v = v, q.y = y, q.J = J, q.Jd = Jd;
    for (i = 0; i < d; i++) y[i] = x[i];
    for (i = 0; i < d * d; i++) J[i] = i % (d + 1) == 0, Jd[i] = 0;
    for (step = 0; step < L; step++) {
        const int layer = enc ? step : L - 1 - step, N = ae->size[layer], n = ae->size[layer + 1];
        const int bent = ae->curves > 0 && layer == L - 1;
        const ld *w = th;
        for (l = 0; l < layer; l++) w += 2 * ae->size[l] * ae->size[l + 1] + ae->size[l];
        if (enc) t_linear(&q, 1, N, n, w);
        if (!bent) t_activation(&q, enc, n, (ld)ae->slope);
        if (!enc && !bent) t_linear(&q, 0, N, n, w);
        if (!enc && bent) t_bent(&q, N, n, ae->degree, w);
    }
}

/* All planes of the block of m. */
static void t_jets(const ld *in, ld *out)
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

static ld t_loss(void *ctx)
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
static void t_force(ld *f)
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

static ld t_force_loss(void *ctx)
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
static ld t_curve(void *ctx)
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

static int dim_in(void) { return m.ae.size[m.enc ? 0 : m.ae.layers]; }
static int dim_out(void) { return m.ae.size[m.enc ? m.ae.layers : 0]; }

static void run(int nb, const roln_real *th, const roln_real *in, roln_real *out, roln_real *tape)
{
    (m.enc ? roln_ae_encode : roln_ae_decode)(&m.ae, m.jets, nb, th, in, out, tape);
}

static void run_bwd(const roln_real *th, const roln_real *tape, const roln_real *g, roln_real *gin, roln_real *gth, roln_real *w)
{
    (m.enc ? roln_ae_encode_bwd : roln_ae_decode_bwd)(&m.ae, m.jets, m.nb, th, tape, g, gin, gth, w);
}

/* Biorthogonal weights with random biases; of a square layer Psi = 2 H, Phi = H / 2, H a reflection. */
static roln_real *weights(uint64_t *s)
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
    for (i = 0; i < m.ae.curves * roln_ae_bent(&m.ae); i++) {
        CHECK(*t == 0); /* W */
        *t++ = ROLN_C(0.3) * roln_normal(s);
    }
    CHECK(t == th + p);
    if (p <= MAXP) widen(p, th, m.th);
    return th;
}

/* a is b + b of the same additions: exactly where one product is added, else to rounding */
static void check_twice(int n, const roln_real *twice, const roln_real *once)
{
    ld top = 0, d = 0;
    int i;
    for (i = 0; i < n; i++) {
        const ld e = fabsl((ld)twice[i] - 2 * (ld)once[i]);
        if (!(e <= d)) d = e;
        if (fabsl((ld)once[i]) > top) top = fabsl((ld)once[i]);
    }
    BOUND("ae: twice the gradient (eps)", n ? d / ((top + 1e-3L) * EPS) : 0, m.jets * m.nb == 1 ? 0 : 12);
}

#ifdef ROLN_DOUBLE
static double *s_th, *s_in, *s_out, *s_g, *s_tape;
static double s_loss(void *ctx)
{
    double s = 0;
    int i;
    (void)ctx;
    run(m.nb, s_th, s_in, s_out, s_tape);
    for (i = 0; i < m.jets * m.nb * dim_out(); i++) s += s_g[i] * s_out[i];
    return s;
}
#endif

/* Forward and backward of one shape, direction and number of jets. */
static void check_jets(roln_ae ae, int enc, int jets, int nb, int slope, uint64_t *s)
{
    static ld ref[MAXB * MAXW];
    const ld amp = (ld)(ae.layers > 4 ? 2 : 1);
    int r, t, ni, no, tp, p = roln_ae_params(&ae);
    roln_real *th, *in, *out, *tape, *g, *gin, *gth, *w, *gin1, *gth1, *one, *one_out;
    m.ae = ae, m.enc = enc, m.jets = jets, m.nb = nb;
    ni = jets * nb * dim_in(), no = jets * nb * dim_out(), tp = tape_size(enc, jets, nb);
    th = weights(s);
    in = normal(ni, AMP(ae), s), out = fresh(no), tape = fresh(tp), g = normal(no, 1, s);
    widen(ni, in, m.in), widen(no, g, m.g);
    run(nb, th, in, out, tape);
    t_jets(m.in, ref);
    for (t = 0; t < jets; t++)
        BOUND("ae: jets (eps)", distance(no / jets, out + t * no / jets, ref + t * no / jets) / EPS, 90);
    CHECK(unused(tp, tape) == 0);

    one = fresh(jets * dim_in()), one_out = fresh(jets * dim_out()), w = fresh(tape_size(enc, jets, 1));
    for (r = 0; r < nb; r++) { /* one by one: the same bits */
        for (t = 0; t < jets; t++) memcpy(one + t * dim_in(), in + (t * nb + r) * dim_in(), (size_t)dim_in() * sizeof *in);
        run(1, th, one, one_out, w);
        for (t = 0; t < jets; t++) CHECK(same(dim_out(), one_out + t * dim_out(), out + (t * nb + r) * dim_out()));
    }

    gin = zeros(ni), gth = zeros(p), w = fresh(bwd_size(enc, jets, nb));
    run_bwd(th, tape, g, gin, gth, w);
    BOUND("ae: gradient of the input (eps)", t_gradient(ni, gin, m.in, 2e-4L, t_loss, NULL) / EPS, 30 * amp + NOISE);
    BOUND("ae: gradient of theta (eps)", t_gradient(p, gth, m.th, 2e-4L, t_loss, NULL) / EPS, 30 * amp + NOISE);
    gin1 = copy(ni, gin), gth1 = copy(p, gth);
    run_bwd(th, tape, g, gin, gth, w);
    check_twice(ni, gin, gin1), check_twice(p, gth, gth1);
    gin = zeros(ni), gth = zeros(p);
    run_bwd(th, tape, g, gin, NULL, w);
    run_bwd(th, tape, g, NULL, gth, w);
    run_bwd(th, tape, g, NULL, NULL, w);
    CHECK(same(ni, gin, gin1) && same(p, gth, gth1));
#ifdef ROLN_DOUBLE
    if (slope && (ae.slope < 1 || ae.curves > 0)) {
        s_th = th, s_in = in, s_out = out, s_g = g, s_tape = tape;
        check_halving(p, gth, th, 5e-3, s_loss, NULL);
        check_halving(ni, gin, in, 5e-3, s_loss, NULL);
    }
#else
    (void)slope;
#endif
    fresh_done();
}

/* ---- activation ---- */

/* Backward of 1, 2 and 3 jets at a, with the slopes r of the twin. */
static void check_act_bwd(const rolni_knee *s, int i, const roln_real *a, const ld *r, ld cancel)
{
    roln_real g[3];
    ld w;
    int j;
    for (j = 1; j <= 3; j++) {
        const ld g0 = 1, g1 = j > 1 ? -0.7L : 0, g2 = j > 2 ? 0.4L : 0, ad = (ld)a[1], add = (ld)a[2];
        const ld t[5] = {r[1] * g0, r[2] * ad * g1, r[3] * ad * ad * g2, r[2] * add * g2, 0};
        g[0] = 1, g[1] = ROLN_C(-0.7), g[2] = ROLN_C(0.4);
        rolni_act_bwd(s, (roln_real)i, j, 1, a, g);
        w = EPS * cancel * (fabsl(t[0]) + fabsl(t[1]) + fabsl(t[2]) + fabsl(t[3]));
        BOUND("activation: backward (eps of terms)", fabsl((ld)g[0] - (t[0] + t[1] + t[2] + t[3])) / w, 6);
        w = EPS * cancel * (fabsl(r[1] * g1) + fabsl(2 * r[2] * ad * g2));
        if (j > 1)
            BOUND("activation: backward (eps of terms)", fabsl((ld)g[1] - (r[1] * g1 + 2 * r[2] * ad * g2)) / w, 6);
        w = EPS * cancel * fabsl(r[1] * g2);
        if (j > 2) BOUND("activation: backward (eps of terms)", fabsl((ld)g[2] - r[1] * g2) / w, 6);
    }
}

static void test_activation(void)
{
    static const double slope[4] = {0.41421356, 0.50952545, 0.1, 1};
    uint64_t seed = 1;
    int ks, e, q, i;
    for (ks = 0; ks < 4; ks++) {
        const roln_real k = (roln_real)slope[ks];
        const rolni_knee s = rolni_knee_of(k);
        const ld kk = (ld)k, cancel = (1 + kk * kk) / (2 * kk * kk); /* k1 / k */
        for (e = -300; e <= 300; e++)
            for (q = 0; q < 4; q++) {
                const roln_real x = (roln_real)((q % 2 ? -1 : 1) * pow(10, e / 10.) * (q < 2 ? 1 : 1.618));
                const ld far = fabsl((ld)x) > 1e9L;
                roln_real a[3], y[3], back[3], one[1];
                ld r[4], u[4], w;
                for (i = 1; i >= -1; i -= 2) {
                    a[0] = x, a[1] = 1 + roln_uniform(&seed), a[2] = roln_normal(&seed);
                    rolni_act(&s, (roln_real)i, 3, 1, a, y);
                    t_act(kk, i, (ld)x, r);
                    u[1] = r[1] * (ld)a[1], u[2] = r[2] * (ld)a[1] * (ld)a[1] + r[1] * (ld)a[2];
                    BOUND("activation: s (eps k1/k)", fabsl((ld)y[0] / r[0] - 1) / (EPS * cancel), 3);
                    BOUND("activation: s' (eps k1/k)", fabsl((ld)y[1] / u[1] - 1) / (EPS * cancel), 3);
                    w = fabsl(r[2]) * (ld)a[1] * (ld)a[1] + fabsl(r[1] * (ld)a[2]) + far * 1e-17L;
                    BOUND("activation: s'' (eps of terms)", fabsl((ld)y[2] - u[2]) / (EPS * cancel * w), 6);
                    rolni_act(&s, (roln_real)i, 1, 1, a, one);
                    CHECK(one[0] == y[0]);
                    rolni_act(&s, (roln_real)i, 2, 1, a, back);
                    CHECK(back[0] == y[0] && back[1] == y[1]);
                    if (i == 1) rolni_act(&s, -1, 3, 1, y, back);
                    else rolni_act(&s, 1, 3, 1, y, back);
                    BOUND("activation: inverse (eps k1/k^2)", fabsl((ld)back[0] / (ld)x - 1) / (EPS * cancel / kk), 3);
                    if (ks == 3) CHECK(y[0] == x && y[1] == a[1] && y[2] == a[2]);
                    check_act_bwd(&s, i, a, r, cancel);
                }
            }
        for (i = -1; i <= 1; i += 2) {
            roln_real a[3] = {0, 1, 1}, y[3];
            rolni_act(&s, (roln_real)i, 3, 1, a, y); /* s(0) = 0, s'(0) = 1 */
            CHECK(y[0] == 0);
            CHECK_NEAR(y[1], 1, 2 * EPS / kk);
            a[0] = poison();
            rolni_act(&s, (roln_real)i, 3, 1, a, y);
            CHECK(!roln_finite(y[0]) && y[0] != y[0]);
            a[0] = (roln_real)INFINITY;
            rolni_act(&s, (roln_real)i, 3, 1, a, y);
            CHECK(y[0] == a[0]);
        }
    }
}

/* The twin itself: its derivatives against differences of its values, along curves. */
static void test_twin(uint64_t *s)
{
    static const roln_ae ae = {3, {6, 5, 4, 2}, SLOPE, STRAIGHT};
    static ld y[3 * MAXW];
    roln_real *in;
    int i;
    for (i = 0; i < 400; i++) {
        const ld k = i % 2 ? 0.41421356L : 0.2L, x = (i - 200) * 0.01L + 0.003L;
        ld r[4], u[4], v[4];
        int q;
        t_act(k, i % 3 ? 1 : -1, x, r);
        t_act(k, i % 3 ? 1 : -1, x + 1e-5L, u), t_act(k, i % 3 ? 1 : -1, x - 1e-5L, v);
        for (q = 0; q < 3; q++) CHECK_NEAR((u[q] - v[q]) / 2e-5L, r[q + 1], 1e-6L);
        t_act(k, i % 3 ? -1 : 1, r[0], u);
        CHECK_NEAR(u[0], x, 1e-15L);
    }
    m.ae = ae, m.jets = 3, m.nb = 1;
    for (m.enc = 0; m.enc < 2; m.enc++) {
        weights(s);
        in = normal(3 * dim_in(), 0.7, s);
        widen(3 * dim_in(), in, m.in), widen(dim_in(), in, curve_x);
        widen(dim_in(), in + dim_in(), curve_v), widen(dim_in(), in + 2 * dim_in(), curve_a);
        t_jets(m.in, y);
        for (curve_i = 0; curve_i < dim_out(); curve_i++) {
            CHECK_NEAR(t_slope(t_curve, NULL, &curve_t, 1e-3L), y[dim_out() + curve_i], 1e-13L);
            CHECK_NEAR(t_slope(t_curve, &m, &curve_t, 1e-3L), y[2 * dim_out() + curve_i], 1e-13L);
        }
        fresh_done();
    }
}

/* ---- left inverse, forces ---- */

/* rho(phi(z)) = z in all three planes, that is D J = I; reduce(lift(tau_z)) = tau_z. */
static void check_inverse(roln_ae ae, uint64_t *s)
{
    enum { nb = 3 };
    const int N = ae.size[0], n = ae.size[ae.layers], p = roln_ae_params(&ae), rows = 3 * nb;
    roln_real *th, *z, *x, *zz, *dec, *enc, *at_x, *tz, *tau, *back;
    int l, i, j, at = 0;
    m.ae = ae;
    th = weights(s);
    for (l = 0; l < ae.layers; l++) { /* Psi^T Phi = I */
        const int a = ae.size[l], b = ae.size[l + 1];
        ld worst = 0;
        for (i = 0; i < b; i++)
            for (j = 0; j < b; j++) {
                ld d = i == j ? -1 : 0, size = 0;
                int q;
                for (q = 0; q < a; q++) d += (ld)th[at + (b + i) * a + q] * (ld)th[at + j * a + q];
                for (q = 0; q < a; q++) size += fabsl((ld)th[at + (b + i) * a + q] * (ld)th[at + j * a + q]);
                if (!(fabsl(d) <= worst * (1 + size))) worst = fabsl(d) / (1 + size);
            }
        BOUND("init: Psi^T Phi = I (eps of terms)", worst / EPS, 100);
        at += 2 * a * b + a;
    }
    CHECK(at + ae.curves * roln_ae_bent(&ae) == p);
    CHECK(roln_ae_check(&ae, th) == ROLN_OK);
    z = normal(rows * n, AMP(ae), s), x = fresh(rows * N), zz = fresh(rows * n);
    dec = fresh(tape_size(0, 3, nb)), enc = fresh(tape_size(1, 3, nb)), at_x = fresh(ROLN_AE_LIFT_TAPE(OF_M, nb));
    roln_ae_decode(&ae, 3, nb, th, z, x, dec);
    roln_ae_encode(&ae, 3, nb, th, x, zz, enc);
    {
        static ld ref[MAXB * 100];
        widen(rows * n, z, ref);
        for (i = 0; i < 3; i++) BOUND("rho(phi(z)) = z (eps)", distance(nb * n, zz + i * nb * n, ref + i * nb * n) / EPS, 300);
        roln_ae_decode(&ae, 1, nb, th, z, x, dec);
        roln_ae_encode(&ae, 1, nb, th, x, zz, enc);
        tz = normal(nb * n, 1, s), tau = fresh(nb * N), back = fresh(nb * n);
        widen(nb * n, tz, ref);
        for (i = 0; i < 2; i++) { /* with the point as the encoder sees it, and as the decoder does */
            roln_ae_lift_tape(&ae, 1, nb, i ? dec : enc, at_x);
            roln_ae_lift(&ae, nb, th, at_x, tz, tau, fresh(ROLN_AE_LIFT_WORK(OF_M, nb)));
            roln_ae_reduce(&ae, nb, th, dec, tau, back, fresh(ROLN_AE_REDUCE_WORK(OF_M, nb)));
            BOUND("reduce(lift(tau_z)) = tau_z (eps)", distance(nb * n, back, ref) / EPS, 150);
        }
    }
    fresh_done();
}

/* The force map of m at in: lift (enc) or reduce. */
static void run_force(const roln_real *th, const roln_real *in, const roln_real *tau, roln_real *f)
{
    roln_real *tape = fresh(tape_size(m.enc, 1, m.nb)), *out = fresh(m.nb * dim_out());
    roln_real *at_x = fresh(ROLN_AE_LIFT_TAPE(OF_M, m.nb)), *w = fresh(ROLN_AE_LIFT_WORK(OF_M, m.nb));
    run(m.nb, th, in, out, tape);
    roln_ae_lift_tape(&m.ae, 1, m.nb, tape, at_x);
    if (m.enc) roln_ae_lift(&m.ae, m.nb, th, at_x, tau, f, w);
    else roln_ae_reduce(&m.ae, m.nb, th, tape, tau, f, fresh(ROLN_AE_REDUCE_WORK(OF_M, m.nb)));
}

/* All derivatives of reduce at one point, in a random direction y of tau_z, against differences; all of its scratch is written. */
static void check_reduce_jac(roln_ae ae, const roln_real *th, ld bound, uint64_t *s)
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

/* Reduce (enc = 0) and lift (enc = 1) against the explicit Jacobian, and the backward of reduce. */
static void check_force(roln_ae ae, int enc, int nb, uint64_t *s)
{
    static ld ref[MAXB * MAXW];
    const int N = ae.size[0], n = ae.size[ae.layers], p = roln_ae_params(&ae), a = nb * (enc ? N : n), b = nb * (enc ? n : N);
    roln_real *th, *in, *tau, *f, *y, *gin, *gtau, *gth, *gin1, *gtau1, *gth1, *w;
    m.ae = ae, m.enc = enc, m.jets = 1, m.nb = nb;
    th = weights(s);
    in = normal(a, AMP(ae), s), tau = normal(b, 1, s), y = normal(a, 1, s), f = fresh(a);
    widen(a, in, m.in), widen(b, tau, m.tau);
    run_force(th, in, tau, f);
    t_force(ref);
    BOUND("force maps (eps)", distance(a, f, ref) / EPS, 20);
    if (!enc) {
        gin = zeros(a), gtau = zeros(b), gth = zeros(p), w = fresh(ROLN_AE_REDUCE_BWD_WORK(OF_M, nb));
        widen(a, y, m.g);
#define REDUCE_BWD(gi, gt, gp) roln_ae_reduce_bwd(&ae, nb, th, in, tau, y, gi, gt, gp, w)
        REDUCE_BWD(gin, gtau, gth);
        BOUND("reduce: gradient of the point (eps)", t_gradient(a, gin, m.in, 2e-4L, t_force_loss, NULL) / EPS, 50 + 2 * NOISE);
        BOUND("reduce: gradient of the force (eps)", t_gradient(b, gtau, m.tau, 2e-4L, t_force_loss, NULL) / EPS, 20 + NOISE);
        BOUND("reduce: gradient of theta (eps)", t_gradient(p, gth, m.th, 2e-4L, t_force_loss, NULL) / EPS, 30 + NOISE);
        gin1 = copy(a, gin), gtau1 = copy(b, gtau), gth1 = copy(p, gth);
        REDUCE_BWD(gin, gtau, gth);
        m.jets = 2;
        check_twice(a, gin, gin1), check_twice(b, gtau, gtau1), check_twice(p, gth, gth1);
        gin = zeros(a), gtau = zeros(b), gth = zeros(p);
        REDUCE_BWD(gin, NULL, NULL);
        REDUCE_BWD(NULL, gtau, NULL);
        REDUCE_BWD(NULL, NULL, gth);
        CHECK(same(a, gin, gin1) && same(b, gtau, gtau1) && same(p, gth, gth1));
        check_reduce_jac(ae, th, 50, s);
    }
    fresh_done();
}

/* What may be left out or stand in place changes no bit: x and z on the tape, no x of the decoder, the tape of a lift in place. */
static void check_in_place(roln_ae ae, int jets, int nb, uint64_t *s)
{
    const int N = ae.size[0], n = ae.size[ae.layers];
    roln_real *th, *x, *z, *zz, *y, *tape, *other, *at_x, *own;
    int end;
    m.ae = ae;
    th = weights(s);
    x = normal(jets * nb * N, 0.7, s), z = fresh(jets * nb * n), zz = fresh(jets * nb * n), y = fresh(jets * nb * N);
    tape = fresh(tape_size(1, jets, nb)), other = fresh(tape_size(1, jets, nb)), at_x = fresh(ROLN_AE_LIFT_TAPE(OF_M, nb));
    roln_ae_encode(&ae, jets, nb, th, x, z, tape);
    if (ae.layers > 0) {
        own = other + ROLN_AE_ENCODE_REST(OF_M, jets, nb);
        memcpy(own, x, (size_t)(jets * nb * N) * sizeof *x);
        roln_ae_encode(&ae, jets, nb, th, own, zz, other);
        CHECK(same(jets * nb * n, z, zz) && same(tape_size(1, jets, nb), tape, other));
    }
    roln_ae_lift_tape(&ae, jets, nb, tape, at_x);
    roln_ae_lift_tape(&ae, jets, nb, tape, tape);
    CHECK(same(ROLN_AE_LIFT_TAPE(OF_M, nb), at_x, tape));

    tape = fresh(tape_size(0, jets, nb)), other = fresh(tape_size(0, jets, nb)), end = tape_size(0, jets, nb) - jets * nb * n;
    roln_ae_decode(&ae, jets, nb, th, z, y, tape);
    roln_ae_decode(&ae, jets, nb, th, z, NULL, other);
    if (ae.layers == 1 && ae.curves > 0) { /* without x there is no s */
        CHECK(unused(jets * nb * n, other) == jets * nb * n);
        memcpy(other, tape, (size_t)(jets * nb * n) * sizeof *tape);
    }
    CHECK(same(tape_size(0, jets, nb), tape, other));
    if (ae.layers > 0) {
        other = fresh(tape_size(0, jets, nb)), zz = fresh(jets * nb * N);
        memcpy(other + end, z, (size_t)(jets * nb * n) * sizeof *z);
        roln_ae_decode(&ae, jets, nb, th, other + end, zz, other);
        CHECK(same(tape_size(0, jets, nb), tape, other) && same(jets * nb * N, y, zz));
        CHECK(same(jets * nb * n, z, other + end));
    }
    fresh_done();
}

/* ---- scratch ---- */

/* Every tape and every scratch is as large as its macro says, no more and no less. */
static void check_rooms(roln_ae ae, int jets, int nb, uint64_t *s)
{
    const int N = ae.size[0], n = ae.size[ae.layers], full = ae.storage == ROLN_FULL, p = roln_ae_params(&ae);
    roln_real *th, *x, *z, *y, *g, *gth, *tape;
    int which[3] = {0, 0, 0};
    m.ae = ae;
    m.ae.storage = ROLN_FULL;
    th = weights(s);
    m.ae = ae;
#ifndef ROLN_DOUBLE
    if (!full) {
        roln_real lo[MAXW * 4], hi[MAXW * 4], *stored = fresh(p);
        int i;
        for (i = 0; i < n; i++) lo[i] = -1, hi[i] = 1;
        CHECK(roln_ae_store(&ae, th, lo, hi, stored, room_of(ROLN_AE_STORE_WORK(OF_M))) == ROLN_OK);
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
    roln_ae_decode_some(&ae, jets, nb, 3, th, which, z, fresh(3 * jets * nb), room_of(some_size(jets, nb))), CHECK_ROOM();
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

/* ---- the check of the left inverse ---- */

/* roln_ae_check sees every entry of every layer, on either side of its bound: adding d Phi_i to Phi_j makes entry i, j of Psi^T Phi
   d larger. Weights that are not finite have no left inverse. */
static void check_off(roln_ae ae, uint64_t *s)
{
    roln_real *th, *phi;
    int l, i, j, q;
    m.ae = ae;
    th = phi = weights(s);
    CHECK(roln_ae_check(&ae, th) == ROLN_OK);
    for (l = 0; l < ae.layers; l++) {
        const int N = ae.size[l], n = ae.size[l + 1], step = n > 8 ? 13 : 1;
        roln_real *was = copy(2 * n * N, phi);
        for (i = 0; i < n; i += step)
            for (j = 0; j < n; j++)
                for (q = 0; q < 4; q++) {
                    const roln_real d = (q % 2 ? 1 : -1) * (q < 2 ? ROLN_C(0.98) : ROLN_C(1.02)) * ROLN_AE_OFF;
                    int k;
                    for (k = 0; k < N; k++) phi[j * N + k] += d * was[i * N + k];
                    CHECK(roln_ae_check(&ae, th) == (q < 2 ? ROLN_OK : ROLN_E_ILL_CONDITIONED));
                    memcpy(phi, was, (size_t)(n * N) * sizeof *was);
                }
        for (i = 0; i < 2 * n * N; i += N * step) {
            phi[i] = i % 2 ? poison() : (roln_real)INFINITY;
            CHECK(roln_ae_check(&ae, th) == ROLN_E_NOT_FINITE);
            phi[i] = was[i];
        }
        phi += 2 * n * N + N;
    }
    CHECK(roln_ae_check(&ae, th) == ROLN_OK);
    fresh_done();
}

/* On its bound to the last bit, Psi^T Phi - I has one entry that is not 0: the first is taken, the next number is not. */
static void check_off_bound(void)
{
    static const roln_ae ae = {1, {2, 2}, SLOPE, STRAIGHT};
    roln_real th[10] = {1, 0, ROLN_AE_OFF, 1, 1, 0, 0, 1};
    CHECK(roln_ae_check(&ae, th) == ROLN_OK);
    th[2] *= 1 + ROLN_EPS;
    CHECK(roln_ae_check(&ae, th) == ROLN_E_ILL_CONDITIONED);
}

/* ---- initialisation ---- */

static void test_init(uint64_t *s)
{
    static const roln_ae big = {1, {200, 100}, SLOPE, STRAIGHT};
    const int p = 100 * 200;
    uint64_t s0 = *s;
    roln_real *th = fresh(roln_ae_params(&big)), *th2 = fresh(roln_ae_params(&big)), *w = fresh(100 * 100 + 100);
    ld sum = 0, sq = 0;
    int i;
    CHECK(roln_ae_init(&big, th, s, w) == ROLN_OK);
    CHECK(roln_ae_init(&big, th2, &s0, w) == ROLN_OK);
    CHECK(s0 == *s && same(roln_ae_params(&big), th, th2));
    for (i = 0; i < p; i++) sum += (ld)th[p + i], sq += (ld)th[p + i] * (ld)th[p + i];
    CHECK_NEAR(sum / p, 0, 4 * 0.0808 / sqrt(p));
    CHECK_NEAR(sqrtl(sq / p), 0.99 * sqrt(2. / 300), 0.0808 * 4 / sqrt(2. * p)); /* four standard errors */
    for (i = 0; i < 200; i++) CHECK(th[2 * p + i] == 0);
    fresh_done();
}

static void check_pod(int layers, int count, uint64_t *s)
{
    enum { N = 6 };
    static const roln_ae shapes[4] = {{0, {N}, SLOPE, STRAIGHT}, {1, {N, 2}, SLOPE, STRAIGHT},
        {2, {N, 4, 2}, SLOPE, STRAIGHT}, {3, {N, 5, 3, 2}, SLOPE, STRAIGHT}};
    static ld X[100 * N], cov[N * N], V[N * N], mean[N], ref[100 * N];
    const roln_ae *ae = &shapes[layers];
    const ld scale = 0.3L;
    const int p = roln_ae_params(ae);
    roln_real *x = fresh(count * N), *th = fresh(p), *z = fresh(count * 2), *y = fresh(count * N), *tape, *w;
    int order[N], i, j, k, r, q;
    m.ae = *ae;
    tape = fresh(tape_size(1, 1, count)), w = fresh(ROLN_AE_POD_WORK(OF_M));
    for (r = 0; r < count; r++) { /* a few directions with gaps between their variances */
        roln_real c[N];
        for (i = 0; i < N; i++) c[i] = roln_normal(s) * (roln_real)(4 >> i);
        for (i = 0; i < N; i++)
            for (x[r * N + i] = (roln_real)(i + 1), j = 0; j < N; j++)
                x[r * N + i] += c[j] * (roln_real)cos(i * (j + 0.5) * 0.5) + ROLN_C(0.01) * c[i];
    }
    CHECK(roln_ae_init_pod(ae, count, x, (roln_real)scale, NULL, th, area, w) == ROLN_OK);
    if (layers == 0) {
        fresh_done();
        return;
    }
    for (i = 0; i < N; i++) mean[i] = 0;
    CHECK(roln_ae_check(ae, th) == ROLN_OK);
    for (r = 0; r < count * N; r++) X[r] = (ld)(roln_real)scale * (ld)x[r], mean[r % N] += X[r] / count;
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++)
            for (cov[i * N + j] = 0, r = 0; r < count; r++) cov[i * N + j] += (X[r * N + i] - mean[i]) * (X[r * N + j] - mean[j]);
    t_jacobi(N, cov, V);
    for (i = 0; i < N; i++) order[i] = i;
    for (i = 0; i < N; i++)
        for (j = i + 1; j < N; j++)
            if (cov[order[j] * (N + 1)] > cov[order[i] * (N + 1)]) k = order[i], order[i] = order[j], order[j] = k;
    for (r = 0; r < count; r++)
        for (i = 0; i < N; i++)
            for (ref[r * N + i] = mean[i], k = 0; k < 2; k++)
                for (q = order[k], j = 0; j < N; j++) ref[r * N + i] += V[i * N + q] * V[j * N + q] * (X[r * N + j] - mean[j]);
    for (i = 0; i < count * N; i++) x[i] *= (roln_real)scale;
    roln_ae_encode(ae, 1, count, th, x, z, tape);
    roln_ae_decode(ae, 1, count, th, z, y, tape);
    BOUND("POD start = POD (eps)", distance(count * N, y, ref) / EPS, 60);
    {
        const roln_real *before = copy(p, th);
        x[3] = (roln_real)INFINITY;
        CHECK(roln_ae_init_pod(ae, count, x, 1, NULL, th, area, w) == ROLN_E_NOT_FINITE);
        CHECK(same(p, th, before));
    }
    fresh_done();
}

/* 100,000 samples, far from 0, of three directions, the last of them 1/300 of the first: it is found as closely as rounding the
   covariance allows, and so what the POD leaves is noise. */
static void test_pod_of_many(uint64_t *s)
{
    enum { N = 6, COUNT = 100000 };
    static const roln_ae shape = {1, {N, 3}, 1, STRAIGHT};
    static const roln_real size[3] = {1, ROLN_C(0.3), ROLN_C(0.003)};
    static ld cov[N * N], V[N * N];
    roln_real *x = fresh(COUNT * N), *th = fresh(roln_ae_params(&shape)), *dir = normal(3 * N, 0.5, s);
    ld mean[N] = {0}, off = 0, least = 0, dot = 0, apart = 0;
    int i, j, k, third = 0;
    m.ae = shape;
    for (k = 0; k < COUNT; k++) {
        roln_real *row = x + k * N;
        for (i = 0; i < N; i++) row[i] = (roln_real)(i + 1) + ROLN_C(1e-4) * roln_normal(s);
        for (j = 0; j < 3; j++) {
            const roln_real a = size[j] * roln_normal(s);
            for (i = 0; i < N; i++) row[i] += a * dir[j * N + i];
        }
        for (i = 0; i < N; i++) mean[i] += (ld)row[i] / COUNT;
    }
    memset(cov, 0, sizeof cov);
    for (k = 0; k < COUNT; k++)
        for (i = 0; i < N; i++)
            for (j = 0; j < N; j++) cov[i * N + j] += ((ld)x[k * N + i] - mean[i]) * ((ld)x[k * N + j] - mean[j]);
    t_jacobi(N, cov, V);
    for (i = 0; i < N; i++) { /* the third largest is third */
        int larger = 0;
        for (j = 0; j < N; j++) larger += cov[j * (N + 1)] > cov[i * (N + 1)];
        if (larger == 2) third = i;
        if (larger > 2) least += cov[i * (N + 1)];
    }
    CHECK(roln_ae_init_pod(&shape, COUNT, x, 1, NULL, th,
                           area_of(ROLN_AE_POD_ROOM(OF_M)), fresh(ROLN_AE_POD_WORK(OF_M))) == ROLN_OK);
    for (i = 0; i < N; i++) {
        dot += (ld)th[2 * N + i] * V[i * N + third];
        CHECK_NEAR(th[6 * N + i], mean[i], PICK(2, 1000) * EPS * mean[i]);
    }
    for (i = 0; i < N; i++) {
        const ld d = (ld)th[2 * N + i] - (dot > 0 ? 1 : -1) * V[i * N + third];
        apart += d * d;
    }
    for (k = 0; k < COUNT; k++) {
        ld d[N], a;
        for (i = 0; i < N; i++) d[i] = (ld)x[k * N + i] - mean[i];
        for (j = 0; j < 3; j++) {
            for (a = 0, i = 0; i < N; i++) a += (ld)th[j * N + i] * ((ld)x[k * N + i] - mean[i]);
            for (i = 0; i < N; i++) d[i] -= a * (ld)th[j * N + i];
        }
        for (i = 0; i < N; i++) off += d[i] * d[i];
    }
    BOUND("POD of 100,000: the third direction", sqrtl(apart), PICK(1e-6L, 1e-9L));
    BOUND("POD of 100,000: what is left", off / least - 1, PICK(2e-5L, 1e-9L));
    fresh_done();
}

/* The coordinates asked for are those of decode, bit for bit. */
static void check_some(const roln_ae *ae, const roln_real *th, uint64_t *s)
{
    enum { nb = 2 };
    const int N = ae->size[0], n = ae->size[ae->layers];
    int which[MAXW + 3], jets, count, i, r;
    for (jets = 1; jets <= 3; jets++) {
        const int size = tape_size(0, jets, nb);
        roln_real *z = normal(jets * nb * n, 0.7, s), *x = fresh(jets * nb * N), *some = fresh(jets * nb * (N + 3));
        roln_real *tape = fresh(size), *w = fresh(some_size(jets, nb));
        roln_ae_decode(ae, jets, nb, th, z, x, tape);
        for (count = 0; count <= N + 3; count++) {
            for (i = 0; i < count; i++) which[i] = roln_randint(N, s);
            roln_ae_decode_some(ae, jets, nb, count, th, which, z, some, w);
            CHECK(same(size, tape, w));
            for (r = 0; r < jets * nb; r++)
                for (i = 0; i < count; i++) CHECK(same(1, some + r * count + i, x + r * N + which[i]));
        }
    }
}

static void test_some(roln_ae ae, uint64_t *s)
{
    m.ae = ae;
    check_some(&ae, weights(s), s);
    fresh_done();
}

/* ---- stored weights ---- */

#ifndef ROLN_DOUBLE
/* Entry j of a row as the header defines it. */
static ld t_entry(int bits, const float *row, int j)
{
    uint32_t w;
    memcpy(&w, row + (bits == 8) + j * bits / 32, sizeof w);
    w = w >> j * bits % 32 & (bits == 8 ? 255 : 65535);
    if (bits == 8) return (ld)row[0] * ((ld)w - (w > 127 ? 256 : 0));
    return (w & 0x8000 ? -1 : 1) * ldexpl((ld)(w & 1023) + (w & 0x7c00 ? 1024 : 0), (int)(w & 0x7c00 ? w >> 10 & 31 : 1) - 25);
}

/* Rows [rows][n], stored, as numbers. */
static void t_unpack(int bits, int rows, int n, const float *from, ld *to)
{
    int i, j;
    for (i = 0; i < rows; i++)
        for (j = 0; j < n; j++) to[i * n + j] = t_entry(bits, from + i * ROLN_AE_ROW(bits, n), j);
}

/* What is stored against what was to be stored, and the three products against sums of what is stored. */
static void check_products(const roln_storage *storage, int rows, int k, int n, uint64_t *s)
{
    static ld B[40 * 40];
    const int bits = storage->bits, row = ROLN_AE_ROW(bits, n);
    float *b = normal(k * n, 0.5, s), *st = fresh(k * row), *a, *c, *one, *j1;
    int i, j, p;
    for (i = 0; i < k * n; i++) b[i] *= i % 7 == 0 ? 1e-3f : 1; /* of different size */
    CHECK(rolni_store_matrix(bits, k, n, b, st) == ROLN_OK);
    t_unpack(bits, k, n, st, B);
    for (i = 0; i < k; i++)
        for (j = 0; j < row * 32 / bits - (bits == 8 ? 4 : 0); j++) {
            const ld w = j < n ? (ld)b[i * n + j] : 0, e = fabsl(t_entry(bits, st + i * row, j) - w);
            BOUND(bits == 8 ? "stored int8: rounding (s)" : "stored half: rounding (2^-11 w + 2^-25)",
                  bits == 8 ? e / (ld)st[i * row] : e / (ldexpl(fabsl(w), -11) + ldexpl(1, -25)), bits == 8 ? 0.50001L : 1);
        }
    a = normal(rows * k, 1, s), c = fresh(rows * n), one = fresh(n);
    storage->mm(rows, k, n, a, st, c); /* rows x k times k x n */
    for (i = 0; i < rows; i++) {
        storage->mm(1, k, n, a + i * k, st, one);
        CHECK(same(n, one, c + i * n));
        for (j = 0; j < n; j++) {
            ld sum = 0, size = 0;
            const float got = storage->column(k, n, j, a + i * k, st);
            for (p = 0; p < k; p++) sum += (ld)a[i * k + p] * B[p * n + j], size += fabsl((ld)a[i * k + p] * B[p * n + j]);
            BOUND("stored: mm (eps of terms)", fabsl((ld)c[i * n + j] - sum) / ((size + 1e-20L) * EPS), 4 + k / 4);
            CHECK(same(1, &got, c + i * n + j));
        }
    }
    a = normal(rows * n, 1, s), c = fresh(rows * k), j1 = fresh(k);
    storage->mm_bt(rows, n, k, a, st, c); /* rows x n times n x k */
    for (i = 0; i < rows; i++) {
        storage->mm_bt(1, n, k, a + i * n, st, j1);
        CHECK(same(k, j1, c + i * k));
        for (j = 0; j < k; j++) {
            ld sum = 0, size = 0;
            for (p = 0; p < n; p++) sum += (ld)a[i * n + p] * B[j * n + p], size += fabsl((ld)a[i * n + p] * B[j * n + p]);
            BOUND("stored: mm_bt (eps of terms)", fabsl((ld)c[i * k + j] - sum) / ((size + 1e-20L) * EPS), 6);
        }
    }
    fresh_done();
}

/* The half nearest to |x| < 65520 by its definition: multiples of 2^(e-10), 2^e <= |x|, e = -14 below 2^-14; half-way to even. */
static uint32_t t_half(float x)
{
    int e;
    ld r, k;
    frexpl(fabsl((ld)x), &e), e = e - 1 < -14 ? -14 : e - 1;
    r = ldexpl(fabsl((ld)x), 10 - e), k = floorl(r);
    k += r - k > 0.5L || (r - k >= 0.5L && fmodl(k, 2) > 0);
    /* the leading one counts as exponent, carries too */
    return (signbit(x) ? 0x8000 : 0) + (uint32_t)k + (uint32_t)(e + 14) * 1024;
}

static void check_half(float x)
{
    CHECK(rolni_to_half(x) == t_half(x) && rolni_to_half(-x) == t_half(-x));
}

/* All halves there and back; ties go to even, what is too large is seen. Floats against the definition: a stride of all,
   and those around every tie below 2^-13. */
static void test_halves(void)
{
    uint32_t h, b;
    for (b = 1; b < UINT32_C(0x477ff000); b += b < UINT32_C(0x33000000) ? 65521 : b < UINT32_C(0x39000000) ? 61 : 4093)
        check_half(rolni_real(b));
    for (h = 0; h < 0x800; h++) { /* half-way behind h, and three floats on either side */
        const uint32_t tie = rolni_bits((float)ldexpl((ld)(h < 1024 ? h : h % 1024 + 1024) + 0.5L, -24));
        for (b = tie - 3; b <= tie + 3; b++) check_half(rolni_real(b));
    }
    for (h = 0; h < 0x7c00; h++) {
        float row[4] = {0, 0, 0, 0}, x, one = 1, y[2];
        const uint32_t both = h | (h | 0x8000) << 16;
        memcpy(row, &both, sizeof both);
        x = (float)t_entry(16, row, 0);
        roln_half_mm(1, 1, 2, &one, row, y);
        CHECK(y[0] == x && y[1] == -x);
        CHECK(rolni_to_half(x) == h && rolni_to_half(-x) == (h | 0x8000));
        if (h > 0) CHECK(rolni_to_half((x + (float)t_entry(16, row, 1) * (1 - 1 / 1024.f)) / 2 + x) >= h);
        if (h % 2 == 0 && h + 1 < 0x7c00) {
            float next[4] = {0, 0, 0, 0};
            const uint32_t up = h + 1;
            memcpy(next, &up, sizeof up);
            CHECK(rolni_to_half((x + (float)t_entry(16, next, 0)) / 2) == h); /* half-way */
        }
    }
    CHECK(rolni_to_half(65519.996f) == 0x7bff && rolni_to_half(65520) >= 0x7c00 && rolni_to_half(3e38f) >= 0x7c00);
}

/* Largest |(I + D) Psi^T Phi - I|_F of a layer of stored weights. */
static ld t_off(const roln_ae *ae, const float *th)
{
    static ld phi[MAXW * MAXW], psi[MAXW * MAXW], D[MAXW * MAXW], A[MAXW * MAXW];
    const int bits = ae->storage->bits;
    ld worst = 0;
    int l, i, j, k;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], row = ROLN_AE_ROW(bits, N);
        ld off = 0;
        t_unpack(bits, n, N, th, phi), t_unpack(bits, n, N, th + n * row, psi), t_unpack(bits, n, n, th + 2 * n * row, D);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                for (A[i * n + j] = 0, k = 0; k < N; k++) A[i * n + j] += psi[i * N + k] * phi[j * N + k];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                ld e = A[i * n + j] - (i == j);
                for (k = 0; k < n; k++) e += D[i * n + k] * A[k * n + j];
                off += e * e;
            }
        if (off > worst) worst = off;
        th += ROLN_AE_LAYER(bits, N, n);
    }
    return sqrtl(worst);
}

/* What roln_ae_check says of stored weights is what long double finds, with Phi scaled to either side of the bound, with D
   forgotten, with two rows of Psi exchanged. */
static void check_stored_off(const roln_ae *ae, const float *theta)
{
    const int bits = ae->storage->bits, size = roln_ae_params(ae);
    int l, change, at = 0, refused = 0;
    CHECK(t_off(ae, theta) < 0.01L && roln_ae_check(ae, theta) == ROLN_OK);
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], row = ROLN_AE_ROW(bits, N);
        for (change = 0; change < 5; change++) {
            float *th = copy(size, theta), *phi = th + at, *psi = phi + n * row, *last = phi + (n - 1) * row;
            ld off;
            if (change < 3 && bits == 8) *last *= change == 0 ? 1.005f : change == 1 ? 0.98f : 1.02f;
            if (change == 3) memset(psi + n * row, 0, (size_t)(n * ROLN_AE_ROW(bits, n)) * sizeof *th);
            if (change == 4) memcpy(psi, theta + at + n * row + (n - 1) * row, (size_t)row * sizeof *th);
            off = t_off(ae, th);
            if (fabsl(off / (ld)ROLN_AE_OFF - 1) < 1e-3L) continue; /* on the bound */
            CHECK(roln_ae_check(ae, th) == (off > (ld)ROLN_AE_OFF ? ROLN_E_ILL_CONDITIONED : ROLN_OK));
            refused += off > (ld)ROLN_AE_OFF;
        }
        at += ROLN_AE_LAYER(bits, N, n);
    }
    CHECK(refused > 0 || bits == 16);
}

/* The twin's weights are those that st stores, Psi = (I + D) Psi_q. */
static void t_stored(const roln_ae *ae, const float *st)
{
    static ld phi[MAXW * MAXW], psi[MAXW * MAXW], D[MAXW * MAXW];
    const int bits = ae->storage->bits;
    int l, i, j, p, at = 0, numbers = 0;
    for (l = 0, p = 0; l < ae->layers; l++) {
        const int a = ae->size[l], b = ae->size[l + 1], row = ROLN_AE_ROW(bits, a);
        t_unpack(bits, b, a, st + at, phi), t_unpack(bits, b, a, st + at + b * row, psi);
        t_unpack(bits, b, b, st + at + 2 * b * row, D);
        for (i = 0; i < a * b; i++) {
            ld sum = psi[i];
            for (j = 0; j < b; j++) sum += D[i / a * b + j] * psi[j * a + i % a];
            m.th[p + i] = phi[i], m.th[p + a * b + i] = sum;
        }
        at += 2 * b * row + b * ROLN_AE_ROW(bits, b);
        for (i = 0; i < a; i++) m.th[p + 2 * a * b + i] = (ld)st[at + i];
        at += a, p += 2 * a * b + a, numbers += a + (bits == 8 ? 3 * b : 0);
    }
    if (ae->curves > 0) {
        const int N = ae->size[ae->layers - 1];
        t_unpack(bits, ae->curves, N, st + at, m.th + p);
        at += ae->curves * ROLN_AE_ROW(bits, N), p += ae->curves * N, numbers += bits == 8 ? ae->curves : 0;
    }
    CHECK(at == roln_ae_params(ae) && p <= MAXP);
    for (i = 0; i < at; i++) numbers -= roln_ae_is_number(ae, i) != 0;
    CHECK(numbers == 0 && roln_ae_is_number(ae, -1) && roln_ae_is_number(ae, at));
}

/* The map of m.enc with m.jets at m.nb samples is the twin, backward and with forces too. */
static void check_stored_map(const roln_ae *ae, const float *st, uint64_t *s)
{
    static ld ref[MAXB * MAXW];
    const int nb = m.nb, ni = m.jets * nb * dim_in(), no = m.jets * nb * dim_out();
    float *in = normal(ni, AMP(*ae), s), *x = fresh(no), *g = normal(no, 1, s), *gin = zeros(ni), *tau, *y, *f, *gtau;
    float *tape = fresh(tape_size(m.enc, m.jets, nb)), *w = fresh(bwd_size(m.enc, m.jets, nb));
    ld off;
    int i, j;
    widen(ni, in, m.in), widen(no, g, m.g);
    run(nb, st, in, x, tape);
    t_jets(m.in, ref);
    for (i = 0, j = nb * dim_out(); i < m.jets; i++)
        BOUND("stored: forward (eps)", distance(j, x + i * j, ref + i * j) / EPS, 60);
    run_bwd(st, tape, g, gin, NULL, w);
    BOUND("stored: gradient of the input (eps)", t_gradient(ni, gin, m.in, 2e-4L, t_loss, NULL) / EPS, 60 + NOISE);
    if (m.jets > 1) return;
    tau = normal(no, 1, s), y = normal(ni, 1, s), f = fresh(ni);
    widen(no, tau, m.tau);
    run_force(st, in, tau, f);
    t_force(ref);
    BOUND("stored: force maps (eps)", distance(ni, f, ref) / EPS, 40);
    if (m.enc) return;
    gin = zeros(ni), gtau = zeros(no), w = fresh(ROLN_AE_REDUCE_BWD_WORK(OF_M, nb));
    widen(ni, y, m.g);
    roln_ae_reduce_bwd(ae, nb, st, in, tau, y, gin, gtau, NULL, w);
    off = t_gradient(ni, gin, m.in, 2e-4L, t_force_loss, NULL) / EPS;
    BOUND("stored: reduce: gradient of the point (eps)", off, 100 + 2 * NOISE);
    off = t_gradient(no, gtau, m.tau, 2e-4L, t_force_loss, NULL) / EPS;
    BOUND("stored: reduce: gradient of the force (eps)", off, 40 + NOISE);
    check_reduce_jac(*ae, st, 100, s);
    m.nb = nb;
}

/* Nearly the left inverse, of points and of forces. */
static void check_stored_inverse(const roln_ae *ae, const float *st, uint64_t *s)
{
    enum { nb = 3 };
    static ld ref[MAXB * MAXW];
    const int N = ae->size[0], n = ae->size[ae->layers], bits = ae->storage->bits;
    float *z = normal(3 * nb * n, AMP(*ae), s), *x = fresh(3 * nb * N), *zz = fresh(3 * nb * n), *tape, *tau, *f, *back, *w;
    int i;
    roln_ae_decode(ae, 3, nb, st, z, x, fresh(tape_size(0, 3, nb)));
    roln_ae_encode(ae, 3, nb, st, x, zz, fresh(tape_size(1, 3, nb)));
    widen(3 * nb * n, z, ref);
    for (i = 0; i < 3; i++)
        BOUND(bits == 8 ? "stored int8: rho(phi(z)) = z" : "stored half: rho(phi(z)) = z",
              distance(nb * n, zz + i * nb * n, ref + i * nb * n), bits == 8 ? 3e-3L : 1e-5L);
    tape = fresh(tape_size(0, 1, nb)), w = fresh(ROLN_AE_LIFT_WORK(OF_M, nb));
    tau = fresh(nb * N), back = fresh(nb * n), f = fresh(ROLN_AE_LIFT_TAPE(OF_M, nb));
    roln_ae_decode(ae, 1, nb, st, z, NULL, tape);
    roln_ae_lift_tape(ae, 1, nb, tape, f);
    roln_ae_lift(ae, nb, st, f, z + nb * n, tau, w);
    roln_ae_reduce(ae, nb, st, tape, tau, back, fresh(ROLN_AE_REDUCE_WORK(OF_M, nb)));
    BOUND(bits == 8 ? "stored int8: reduce(lift(tau_z))" : "stored half: reduce(lift(tau_z))",
          distance(nb * n, back, ref + nb * n), bits == 8 ? 1e-3L : 1e-5L);
}

/* A stored autoencoder is the twin with the weights that it stores, in every jet; and nearly the left inverse. */
static void check_stored(roln_ae ae, const roln_storage *storage, uint64_t *s)
{
    const int n = ae.size[ae.layers];
    float *th, *st, *w, *lo = fresh(n), *hi = fresh(n);
    int i;
    m.ae = ae;
    th = weights(s);
    for (i = 0; i < n; i++) lo[i] = -1.5f, hi[i] = 1.5f;
    m.ae.storage = ae.storage = storage;
    st = fresh(roln_ae_params(&ae));
    w = fresh(ROLN_AE_STORE_WORK(OF_M));
    CHECK(roln_ae_store(&ae, th, lo, hi, st, w) == ROLN_OK);
    t_stored(&ae, st);
    m.nb = 3;
    for (m.enc = 0; m.enc < 2; m.enc++)
        for (m.jets = 1; m.jets <= 3; m.jets++) check_stored_map(&ae, st, s);
    check_stored_inverse(&ae, st, s);
    fresh_done();
    st = copy(roln_ae_params(&ae), st);
    check_some(&ae, st, s);
    check_stored_off(&ae, st);
    fresh_done();
}

/* What can not be stored is refused, and theta stays as it was. */
static void test_refused(const roln_storage *storage, uint64_t *s)
{
    roln_ae ae = {2, {6, 4, 2}, SLOPE, STRAIGHT};
    const int params = roln_ae_params(&ae);
    static const float bad[3] = {INFINITY, -INFINITY, NAN};
    float z[4] = {-1, -1, 1, 1}, *th, *st, *was, *w;
    int i, j, size;
    m.ae = ae;
    th = weights(s);
    ae.storage = storage, size = roln_ae_params(&ae);
    st = normal(size, 1, s), was = copy(size, st), m.ae = ae, w = fresh(ROLN_AE_STORE_WORK(OF_M));
#define STORE() roln_ae_store(&ae, th, z, z + 2, st, w)
    for (j = 0; j < 3; j++) {
        for (i = 0; i < params; i++) {
            const float x = th[i];
            th[i] = bad[j];
            CHECK(STORE() == ROLN_E_NOT_FINITE);
            th[i] = x;
        }
        for (i = 0; i < 4; i++) {
            const float x = z[i];
            z[i] = bad[j];
            CHECK(STORE() == ROLN_E_NOT_FINITE);
            z[i] = x;
        }
    }
    for (i = 0; i < 2; i++) { /* no range, as before NAME_fit_range; an empty one; one upside down */
        static const float range[4][2] = {{0, 0}, {1, 1}, {1, -1}, {3e38f, -3e38f}};
        for (j = 0; j < 4; j++) {
            z[i] = range[j][0], z[2 + i] = range[j][1];
            CHECK(STORE() == ROLN_E_RANGE);
        }
        z[i] = -3e38f, z[2 + i] = 3e38f; /* beyond what float can span */
        CHECK(STORE() == ROLN_E_NOT_FINITE);
        z[i] = -1, z[2 + i] = 1;
    }
    for (j = 0; j < 3; j++) { /* rows of zeros, of denormals; of the largest numbers */
        float row[6];
        const roln_status want = j < 2 ? ROLN_E_ILL_CONDITIONED : storage->bits == 16 ? ROLN_E_RANGE : ROLN_E_ILL_CONDITIONED;
        for (i = 0; i < 8; i++) { /* Phi, Psi */
            memcpy(row, th + 6 * i, sizeof row);
            th[6 * i] = j == 0 ? 0 : j == 1 ? 1e-40f : 3e38f, th[6 * i + 1] = th[6 * i + 2] = th[6 * i + 3] = 0;
            th[6 * i + 4] = th[6 * i + 5] = j == 2 ? 1e38f : 0;
            if (i >= 4) CHECK(STORE() == want);
            else CHECK(j < 2 || STORE() != ROLN_OK);
            memcpy(th + 6 * i, row, sizeof row);
        }
    }
    { /* no start for training */
        float *scratch = fresh(ROLN_AE_POD_WORK(OF_M) + ROLN_AE_INIT_WORK(OF_M));
        uint64_t seed = 5;
        CHECK(roln_ae_init(&ae, st, &seed, scratch) == ROLN_E_SHAPE && seed == 5);
        CHECK(roln_ae_init_pod(&ae, 10, th, 1, NULL, st, area, scratch) == ROLN_E_SHAPE);
    }
    CHECK(same(size, st, was));
    CHECK(STORE() == ROLN_OK && !same(size, st, was));
    fresh_done();
}

/* The left inverse as rows of Psi come closer to each other: good or refused, never bad. With rows apart, and with halves, none is
   refused; of rows that int8 can hardly tell apart most are. Slope 1: no activation between u and z. */
static void test_parallel(const roln_storage *storage)
{
    enum { N = 16, n = 4, TRIES = 20 };
    static const float lo[n] = {-1, -1, -1, -1}, hi[n] = {1, 1, 1, 1};
    uint64_t s = 5;
    int power, try, i, j, k, refused;
    for (power = 0; power <= 10; power += 2) {
        for (try = refused = 0; try < TRIES; try++) {
            roln_ae ae = {1, {N, n}, 1, STRAIGHT};
            float *th, *psi, *st, *w, x[N], z[n], y[n], tape[N + n];
            ld A[n * n], B[n * N], off, size;
            roln_status code;
            m.ae = ae, th = weights(&s), psi = th + n * N;
            for (i = N; i < n * N; i++) psi[i] = psi[i % N] + ldexpf(psi[i], -power); /* psi_i = psi_0 + .. / 2^power */
            widen(n * N, psi, B);
            for (i = 0; i < n * n; i++)
                for (A[i] = 0, j = 0; j < N; j++) A[i] += B[i / n * N + j] * B[i % n * N + j];
            t_solve(n, N, A, B); /* Phi^T = (Psi^T Psi)^-1 Psi^T */
            for (i = 0; i < n * N; i++) th[i] = (float)B[i];
            ae.storage = storage, m.ae = ae, st = fresh(roln_ae_params(&ae)), w = fresh(ROLN_AE_STORE_WORK(OF_M));
            code = roln_ae_store(&ae, th, lo, hi, st, w);
            CHECK(code == ROLN_OK || code == ROLN_E_ILL_CONDITIONED);
            CHECK(code != ROLN_OK || roln_ae_check(&ae, st) == ROLN_OK);
            refused += code != ROLN_OK;
            for (k = 0; k < 50 && code == ROLN_OK; k++) {
                for (i = 0; i < n; i++) z[i] = 2 * roln_uniform(&s) - 1;
                roln_ae_decode(&ae, 1, 1, st, z, x, tape);
                roln_ae_encode(&ae, 1, 1, st, x, y, tape);
                for (i = 0, off = size = 0; i < n; i++) {
                    const ld d = (ld)y[i] - (ld)z[i];
                    off += d * d, size += (ld)z[i] * (ld)z[i];
                }
                if (storage->bits == 8) BOUND("parallel rows int8: |rho(phi(z)) - z| / |z|", sqrtl(off / size), 0.0101L);
                else BOUND("parallel rows half: |rho(phi(z)) - z| / |z|", sqrtl(off / size), 0.0101L);
            }
            fresh_done();
        }
        CHECK(power <= 4 || storage->bits == 16 ? refused == 0 : power < 10 || refused > TRIES / 2);
    }
}

static void test_stored(const roln_ae *shapes, int count, uint64_t *s)
{
    static const roln_storage *const storages[2] = {&roln_half, &roln_int8};
    int t, rows, k, n, i;
    test_halves();
    for (t = 0; t < 2; t++) {
        for (rows = 1; rows <= 5; rows++)
            for (k = 1; k <= 19; k += 1 + k / 9)
                for (n = 1; n <= 35; n += 1 + n / 9) check_products(storages[t], rows, k, n, s);
        for (i = 0; i < count; i++)
            if (shapes[i].layers > 0) check_stored(shapes[i], storages[t], s);
        test_refused(storages[t], s);
        test_parallel(storages[t]);
    }
    for (t = 0; t < 2; t++)
        for (i = 0; i < count; i++)
            for (rows = 1; rows <= 5; rows += 4) {
                roln_ae ae = shapes[i];
                ae.storage = storages[t];
                check_rooms(ae, 2, rows, s);
            }
}
#endif

/* The same for autoencoders whose last layer is bent. */
static void test_bent(void)
{
    static const roln_ae bent[] = {{1, {3, 1}, 1, BENT(1, 8)}, {1, {4, 2}, SLOPE, BENT(2, 3)}, {1, {7, 3}, SLOPE, BENT(3, 4)},
        {1, {6, 5}, SLOPE, BENT(5, 2)}, {2, {6, 4, 2}, SLOPE, BENT(2, 4)}, {2, {7, 5, 3}, 1, BENT(3, 2)},
        {3, {5, 5, 4, 2}, ROLN_C(0.50952545), BENT(2, 5)}};
    uint64_t seed = 4;
    int i, enc, jets, nb;
    for (i = 0; i < (int)(sizeof bent / sizeof *bent); i++) {
        for (enc = 0; enc < 2; enc++)
            for (jets = 1; jets <= 3; jets++)
                for (nb = 1; nb <= 4; nb += nb < 2 ? 1 : 2) check_jets(bent[i], enc, jets, nb, nb == 2, &seed);
        check_inverse(bent[i], &seed);
        for (enc = 0; enc < 2; enc++)
            for (nb = 1; nb <= 3; nb++) check_force(bent[i], enc, nb, &seed);
        test_some(bent[i], &seed);
        check_off(bent[i], &seed);
        for (jets = 1; jets <= 3; jets++)
            for (nb = 1; nb <= 5; nb += 4) check_in_place(bent[i], jets, nb, &seed), check_rooms(bent[i], jets, nb, &seed);
    }
#ifndef ROLN_DOUBLE
    for (i = 0; i < (int)(sizeof bent / sizeof *bent); i++)
        for (nb = 0; nb < 2; nb++) {
            roln_ae ae = bent[i];
            check_stored(ae, nb ? &roln_int8 : &roln_half, &seed);
            ae.storage = nb ? &roln_int8 : &roln_half;
            for (jets = 1; jets <= 3; jets++) check_rooms(ae, jets, 1 + 4 * nb, &seed);
        }
#endif
}

void TEST_NAME(ae)(void)
{
    static const roln_ae shapes[] = {{0, {3}, SLOPE, STRAIGHT}, {1, {4, 2}, SLOPE, STRAIGHT}, {1, {2, 1}, ROLN_C(0.2), STRAIGHT},
        {2, {6, 4, 3}, ROLN_C(0.50952545), STRAIGHT}, {3, {7, 5, 4, 2}, SLOPE, STRAIGHT}, {2, {5, 3, 1}, 1, STRAIGHT},
        {3, {5, 4, 3, 3}, SLOPE, STRAIGHT}, {4, {9, 8, 4, 3, 1}, SLOPE, STRAIGHT}};
    static const roln_ae deep[] = {{5, {7, 6, 5, 4, 3, 2}, SLOPE, STRAIGHT}, {6, {7, 6, 5, 4, 3, 2, 1}, ROLN_C(0.7), STRAIGHT},
        {7, {8, 7, 6, 5, 4, 3, 2, 1}, ROLN_C(0.7), STRAIGHT}, {8, {10, 9, 8, 7, 6, 5, 4, 3, 2}, ROLN_C(0.7), STRAIGHT}};
    static const roln_ae even[] = {{1, {4, 4}, SLOPE, STRAIGHT}, {3, {4, 4, 4, 4}, SLOPE, STRAIGHT}}; /* no layer reduces */
    static const roln_ae large[] = {{3, {33, 24, 13, 6}, SLOPE, STRAIGHT}, {2, {80, 40, 16}, SLOPE, STRAIGHT}};
    const int ns = (int)(sizeof shapes / sizeof *shapes);
    uint64_t seed = 3;
    int i, enc, jets, nb;
    test_activation();
    test_twin(&seed);
    for (enc = 0; enc < 2; enc++)
        for (jets = 1; jets <= 3; jets++) {
            for (i = 0; i < ns; i++)
                for (nb = 1; nb <= 4; nb += nb < 2 ? 1 : 2) check_jets(shapes[i], enc, jets, nb, nb == 2, &seed);
            for (i = 0; i < 4; i++) check_jets(deep[i], enc, jets, 1, 0, &seed);
        }
    for (i = 0; i < ns; i++) {
        check_inverse(shapes[i], &seed);
        for (enc = 0; enc < 2; enc++)
            for (nb = 1; nb <= 3; nb++) check_force(shapes[i], enc, nb, &seed);
    }
    check_inverse(large[0], &seed);
    check_inverse(large[1], &seed);
    test_init(&seed);
    for (i = 0; i <= 3; i++) check_pod(i, 40, &seed), check_pod(i, 5, &seed);
    test_pod_of_many(&seed);
    for (i = 0; i < ns; i++) test_some(shapes[i], &seed);
#ifndef ROLN_DOUBLE
    test_stored(shapes, ns, &seed);
#endif
    for (jets = 1; jets <= 3; jets++)
        for (nb = 1; nb <= 5; nb += 4) {
            for (i = 0; i < ns; i++) check_in_place(shapes[i], jets, nb, &seed), check_rooms(shapes[i], jets, nb, &seed);
            for (i = 0; i < 4; i++) check_in_place(deep[i], jets, nb, &seed), check_rooms(deep[i], jets, nb, &seed);
            for (i = 0; i < 2; i++) check_in_place(even[i], jets, nb, &seed), check_rooms(even[i], jets, nb, &seed);
            check_rooms(large[0], jets, nb, &seed);
        }
    for (i = 0; i < ns; i++) check_off(shapes[i], &seed);
    check_off(deep[3], &seed), check_off(large[1], &seed), check_off_bound();
    test_bent();
    print_bounds();
}
