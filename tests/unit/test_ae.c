/* SPDX-License-Identifier: MIT */
/* Constrained autoencoder (roln_ae.h) against twins in long double (autoencoder.h): the activation in its published form (Otto,
   Macchio, Rowley 2023), jets of encoder and decoder, force maps, and central differences of the twins for every backward; the left
   inverse and its check; starting weights. Stored weights: test_ae_stored.c. */
#include "roln_ae.h"
#include "autoencoder.h"

void TEST_NAME(ae)(void);

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
    if (slope && (ae.slope < 1 || ae.monomials > 0)) {
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
    static const roln_ae ae = {.layers = 3, .size = {6, 5, 4, 2}, .slope = SLOPE, STRAIGHT};
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
    CHECK(at + ae.monomials * roln_ae_bent(&ae) == p);
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
    if (ae.layers == 1 && ae.monomials > 0) { /* without x there is no s */
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
    static const roln_ae ae = {.layers = 1, .size = {2, 2}, .slope = SLOPE, STRAIGHT};
    roln_real th[10] = {1, 0, ROLN_AE_OFF, 1, 1, 0, 0, 1};
    CHECK(roln_ae_check(&ae, th) == ROLN_OK);
    th[2] *= 1 + ROLN_EPS;
    CHECK(roln_ae_check(&ae, th) == ROLN_E_ILL_CONDITIONED);
}

/* ---- initialisation ---- */

static void test_init(uint64_t *s)
{
    static const roln_ae big = {.layers = 1, .size = {200, 100}, .slope = SLOPE, STRAIGHT};
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
    static const roln_ae depth[4] = {
        {.layers = 0, .size = {N}, .slope = SLOPE, STRAIGHT},
        {.layers = 1, .size = {N, 2}, .slope = SLOPE, STRAIGHT},
        {.layers = 2, .size = {N, 4, 2}, .slope = SLOPE, STRAIGHT},
        {.layers = 3, .size = {N, 5, 3, 2}, .slope = SLOPE, STRAIGHT},
    };
    static ld X[100 * N], cov[N * N], V[N * N], mean[N], ref[100 * N];
    const roln_ae *ae = &depth[layers];
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
    static const roln_ae shape = {.layers = 1, .size = {N, 3}, .slope = 1, STRAIGHT};
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

/* The same for autoencoders whose last layer is bent. */
static void test_bent(void)
{
    uint64_t seed = 80;
    int i, enc, jets, nb;
    for (i = 0; i < BENT_SHAPES; i++) {
        for (enc = 0; enc < 2; enc++)
            for (jets = 1; jets <= 3; jets++)
                for (nb = 1; nb <= 4; nb += nb < 2 ? 1 : 2) check_jets(bent[i], enc, jets, nb, nb == 2, &seed);
        check_inverse(bent[i], &seed);
        for (enc = 0; enc < 2; enc++)
            for (nb = 1; nb <= 3; nb++) check_force(bent[i], enc, nb, &seed);
        check_off(bent[i], &seed);
        for (jets = 1; jets <= 3; jets++)
            for (nb = 1; nb <= 5; nb += 4) check_in_place(bent[i], jets, nb, &seed), check_rooms(bent[i], jets, nb, &seed);
    }
}

void TEST_NAME(ae)(void)
{
    static const roln_ae deep[4] = {
        {.layers = 5, .size = {7, 6, 5, 4, 3, 2}, .slope = SLOPE, STRAIGHT},
        {.layers = 6, .size = {7, 6, 5, 4, 3, 2, 1}, .slope = ROLN_C(0.7), STRAIGHT},
        {.layers = 7, .size = {8, 7, 6, 5, 4, 3, 2, 1}, .slope = ROLN_C(0.7), STRAIGHT},
        {.layers = 8, .size = {10, 9, 8, 7, 6, 5, 4, 3, 2}, .slope = ROLN_C(0.7), STRAIGHT},
    };
    static const roln_ae even[2] = { /* no layer reduces */
        {.layers = 1, .size = {4, 4}, .slope = SLOPE, STRAIGHT},
        {.layers = 3, .size = {4, 4, 4, 4}, .slope = SLOPE, STRAIGHT},
    };
    static const roln_ae large[2] = {
        {.layers = 3, .size = {33, 24, 13, 6}, .slope = SLOPE, STRAIGHT},
        {.layers = 2, .size = {80, 40, 16}, .slope = SLOPE, STRAIGHT},
    };
    uint64_t seed = 3;
    int i, enc, jets, nb;
    test_activation();
    test_twin(&seed);
    for (enc = 0; enc < 2; enc++)
        for (jets = 1; jets <= 3; jets++) {
            for (i = 0; i < SHAPES; i++)
                for (nb = 1; nb <= 4; nb += nb < 2 ? 1 : 2) check_jets(shapes[i], enc, jets, nb, nb == 2, &seed);
            for (i = 0; i < 4; i++) check_jets(deep[i], enc, jets, 1, 0, &seed);
        }
    for (i = 0; i < SHAPES; i++) {
        check_inverse(shapes[i], &seed);
        for (enc = 0; enc < 2; enc++)
            for (nb = 1; nb <= 3; nb++) check_force(shapes[i], enc, nb, &seed);
    }
    check_inverse(large[0], &seed);
    check_inverse(large[1], &seed);
    test_init(&seed);
    for (i = 0; i <= 3; i++) check_pod(i, 40, &seed), check_pod(i, 5, &seed);
    test_pod_of_many(&seed);
    for (jets = 1; jets <= 3; jets++)
        for (nb = 1; nb <= 5; nb += 4) {
            for (i = 0; i < SHAPES; i++) check_in_place(shapes[i], jets, nb, &seed), check_rooms(shapes[i], jets, nb, &seed);
            for (i = 0; i < 4; i++) check_in_place(deep[i], jets, nb, &seed), check_rooms(deep[i], jets, nb, &seed);
            for (i = 0; i < 2; i++) check_in_place(even[i], jets, nb, &seed), check_rooms(even[i], jets, nb, &seed);
            check_rooms(large[0], jets, nb, &seed);
        }
    for (i = 0; i < SHAPES; i++) check_off(shapes[i], &seed);
    check_off(deep[3], &seed), check_off(large[1], &seed), check_off_bound();
    test_bent();
    print_bounds();
}
