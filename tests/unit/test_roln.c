/* The whole model (roln.h): loss and gradient against a slow loss and central differences, units, prediction, errors,
   packed and written parameters, failures, work sizes, training. */
#include "small.h"
#include <stdlib.h>

void TEST_NAME(roln)(void);

enum { MAXD = 4000, KINDS = 6, TERMS = 10 };
#define ACC(kind) ((kind) / 2 == 1)
#define POS(kind) ((kind) >= 4)
static ld worst[9];
#define WORST(k, e, bound) (worst[k] = (e) > worst[k] ? (e) : worst[k], CHECK_BELOW(e, bound))

/* Data of `count` windows: kind 0 ODE, torque, stride 1; 1 ODE, no torque, stride 2, given starts; 2, 3 acceleration; 4, 5 positions
   only (the variational loss), else as 0, 1. */
typedef struct { roln_real q[MAXD], qd[MAXD], qdd[MAXD], tau[MAXD]; int start[8]; roln_batch b; } data;

static roln_real step; /* of the data last made */

static void make(int k, int kind, int count, uint64_t *s, data *d)
{
    const int N = N_OF(k), H = ACC(kind) ? 0 : models[k].horizon, stride = kind % 2 + 1, len = H * stride + 1;
    const int soft = POS(kind) || k == 7; /* a motion that midpoint can follow */
    int i, all = (count * len + stride) * N;
    step = soft ? dt / 8 : dt;
    CHECK(all <= MAXD && count <= 8);
    dyadic(all, 2, s, d->q), dyadic(all, soft ? 1 : 2, s, d->qd), dyadic(all, 4, s, d->qdd), dyadic(all, soft ? 1 : 4, s, d->tau);
    for (i = N; i < all && POS(kind); i++) d->q[i] = d->q[i % N] + d->q[i] / 64;
    for (i = 0; i < count; i++) d->start[i] = (count - 1 - i) * len;
    d->b.count = count, d->b.steps = H, d->b.stride = stride, d->b.start = kind % 2 ? d->start : NULL;
    d->b.q = d->q, d->b.qd = POS(kind) ? NULL : d->qd, d->b.qdd = ACC(kind) ? d->qdd : NULL;
    d->b.tau = kind % 2 && !ACC(kind) ? NULL : d->tau;
}

static const roln_loss weights = {ROLN_C(1.0),   ROLN_C(0.5),  ROLN_C(0.75),   ROLN_C(0.625), ROLN_C(0.875),
                                  ROLN_C(0.375), ROLN_C(0.25), ROLN_C(1.0625), ROLN_C(0.4375), ROLN_C(0.6875)};

static roln_status grad_of(int k, const roln_scale *sc, const roln_real *theta, const roln_batch *b, int nb, roln_real *g, roln_real *terms)
{
    roln_loss loss;
    roln_real windows = 0;
    roln_status st;
    memset(g, 0, (size_t)models[k].params * sizeof *g);
    memset(&loss, 0, sizeof loss);
    st = roln_grad(models[k].md, sc, theta, &weights, b, b->qdd != NULL, nb, step, g, &loss, &windows, work_of(grad_work(k, nb, b->steps)));
    CHECK(WORK_KEPT());
    CHECK(st != ROLN_OK || windows == (roln_real)b->count);
    memcpy(terms, &loss, sizeof loss);
    return st;
}

static double weighted(const roln_real *terms)
{
    roln_real w[TERMS];
    double s = 0;
    int i;
    memcpy(w, &weights, sizeof w);
    for (i = 0; i < TERMS; i++) s += (double)w[i] * (double)terms[i];
    return s;
}

/* The double gradient and loss, for the float test. */
void test_roln_reference(int k, int kind, double *g, double *terms);
#ifdef ROLN_DOUBLE
void test_roln_reference(int k, int kind, double *g, double *terms)
{
    static data d;
    static roln_real theta[MAXP];
    uint64_t s = (uint64_t)(10 * k + kind);
    parameters(k, &s, theta);
    make(k, kind, 3, &s, &d);
    CHECK(grad_of(k, &scale, theta, &d.b, 16, g, terms) == ROLN_OK);
}
#endif

/* Loss from math.md section 5, sample by sample with the functions of prediction. */
static void slow_loss(int k, const roln_scale *sc, const roln_real *theta, const roln_batch *b, ld *terms)
{
    const roln_model *m = models[k].md;
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k), H = b->steps;
    const ld sq = 1 / ((ld)sc->q * (ld)sc->q), st = (ld)sc->t * (ld)sc->t;
    roln_real z[16], zd[16], p[16], pd[16], x[16], xd[16], tau[16];
    int w, h, i, j;
    for (i = 0; i < TERMS; i++) terms[i] = 0;
    for (w = 0; w < b->count; w++)
        for (h = 0; h <= H; h++) {
            const int at = ((b->start ? b->start[w] : w * (H * b->stride + 1)) + h * b->stride) * N;
            CHECK(roln_encode(m, sc, theta, b->q + at, b->qd + at, NULL, z, zd, NULL, work_of(tick_work(k))) == ROLN_OK);
            CHECK(roln_decode(m, sc, theta, z, zd, x, xd, work_of(tick_work(k))) == ROLN_OK);
            for (i = 0; i < N; i++) {
                const ld e = (ld)x[i] - (ld)b->q[at + i], f = (ld)xd[i] - (ld)b->qd[at + i];
                terms[0] += e * e * sq / (H + 1), terms[1] += f * f * sq * st / (H + 1);
            }
            if (h == 0) memcpy(p, z, sizeof p), memcpy(pd, zd, sizeof pd);
            else {
                for (i = 0; i < nu && b->tau; i++) {
                    ld sum = 0;
                    for (j = 0; j < b->stride; j++) sum += (ld)b->tau[(at / N + j - b->stride) * nu + i] / b->stride;
                    tau[i] = (roln_real)sum;
                }
                CHECK(roln_step(m, sc, theta, p, pd, b->tau ? tau : NULL, step, work_of(tick_work(k))) == ROLN_OK && WORK_KEPT());
                CHECK(roln_decode(m, sc, theta, p, pd, x, xd, work_of(tick_work(k))) == ROLN_OK);
                for (i = 0; i < n; i++) {
                    const ld e = (ld)p[i] - (ld)z[i], f = (ld)pd[i] - (ld)zd[i];
                    terms[3] += e * e / H, terms[4] += f * f * st / H;
                }
                for (i = 0; i < N; i++) {
                    const ld e = (ld)x[i] - (ld)b->q[at + i], f = (ld)xd[i] - (ld)b->qd[at + i];
                    terms[6] += e * e * sq / H, terms[7] += f * f * sq * st / H;
                }
            }
        }
}

#ifdef ROLN_DOUBLE
/* Acceleration loss: second time derivatives of encoder and decoder by Richardson differences along a parabola. */
static void slow_loss_acc(int k, const roln_scale *sc, const roln_real *theta, const roln_batch *b, ld *terms)
{
    static const double h[4] = {2e-4, -2e-4, 4e-4, -4e-4};
    const roln_model *m = models[k].md;
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    double v[4][16], z[16], zd[16], acc[2][16], x[16], xd[16], a[16], M[64], c[16], g[16], d[16], tz[16], tau[16];
    int w, i, j, p;
    for (i = 0; i < TERMS; i++) terms[i] = 0;
    for (w = 0; w < b->count; w++) {
        const int at = (b->start ? b->start[w] : w) * N;
        for (j = 0; j < 4; j++) {
            for (i = 0; i < N; i++) {
                x[i] = b->q[at + i] + h[j] * b->qd[at + i] + h[j] * h[j] / 2 * b->qdd[at + i];
                xd[i] = b->qd[at + i] + h[j] * b->qdd[at + i];
            }
            CHECK(roln_encode(m, sc, theta, x, xd, NULL, z, v[j], NULL, work_of(tick_work(k))) == ROLN_OK);
        }
        for (i = 0; i < n; i++) acc[0][i] = (8 * (v[0][i] - v[1][i]) - (v[2][i] - v[3][i])) / 2.4e-3;
        CHECK(roln_encode(m, sc, theta, b->q + at, b->qd + at, NULL, z, zd, NULL, work_of(tick_work(k))) == ROLN_OK);
        CHECK(roln_terms(m, sc, theta, z, zd, M, c, g, d, NULL, NULL, work_of(tick_work(k))) == ROLN_OK);
        for (i = 0; i < nu; i++)
            tau[i] = b->tau ? b->tau[at / N * nu + i] : 0;
        CHECK(roln_reduce(m, sc, theta, z, tau, tz, work_of(tick_work(k))) == ROLN_OK);
        for (i = 0; i < n; i++) { /* force: inverse dynamics of the data */
            double r = c[i] + g[i] + d[i] - tz[i];
            for (j = 0; j < n; j++) r += M[i * n + j] * acc[0][j];
            terms[9] += (ld)(r * r) * powl((ld)sc->t, 4);
        }
        CHECK(roln_chol(n, M, M) == ROLN_OK);
        for (i = 0; i < n; i++) a[i] = tz[i] - c[i] - g[i] - d[i];
        roln_solve_lower(n, M, a, a), roln_solve_lower_t(n, M, a, acc[1]);
        for (i = 0; i < n; i++) terms[5] += (ld)((acc[1][i] - acc[0][i]) * (acc[1][i] - acc[0][i])) * powl((ld)sc->t, 4);
        for (p = 0; p < 2; p++) {
            double y[16], yd[16];
            for (j = 0; j < 4; j++) {
                for (i = 0; i < n; i++) y[i] = z[i] + h[j] * zd[i] + h[j] * h[j] / 2 * acc[p][i], yd[i] = zd[i] + h[j] * acc[p][i];
                CHECK(roln_decode(m, sc, theta, y, yd, x, v[j], work_of(tick_work(k))) == ROLN_OK);
            }
            CHECK(roln_decode(m, sc, theta, z, zd, x, xd, work_of(tick_work(k))) == ROLN_OK);
            for (i = 0; i < N; i++) {
                const double e = (8 * (v[0][i] - v[1][i]) - (v[2][i] - v[3][i])) / 2.4e-3 - b->qdd[at + i];
                terms[p ? 8 : 2] += (ld)(e * e / (sc->q * sc->q)) * powl((ld)sc->t, 4);
                if (p) continue;
                terms[0] += (ld)((x[i] - b->q[at + i]) * (x[i] - b->q[at + i]) / (sc->q * sc->q));
                terms[1] += (ld)((xd[i] - b->qd[at + i]) * (xd[i] - b->qd[at + i]) * sc->t * sc->t / (sc->q * sc->q));
            }
        }
    }
}
#endif

#ifdef ROLN_DOUBLE
/* Variational loss from the discrete Euler-Lagrange equations, grad_z T by differences of the kinetic energy. */
static void slow_loss_positions(int k, const roln_scale *sc, const roln_real *theta, const roln_batch *b, ld *terms)
{
    static const double c[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    roln_model m = *models[k].md;
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k), H = b->steps;
    const ld sq = 1 / ((ld)sc->q * (ld)sc->q);
    double z[10][16], still[16] = {0}, none[16], zm[16], v[16], M[64], M1[64], g[16], d[16], T, tau[16], tz[16], p[16], x[16];
    int w, h, i, j, s;
    m.scheme = ROLN_MIDPOINT;
    for (i = 0; i < TERMS; i++) terms[i] = 0;
    for (w = 0; w < b->count; w++) {
        const int first = b->start ? b->start[w] : w * (H * b->stride + 1);
        for (h = 0; h <= H; h++) {
            const double *q = b->q + (first + h * b->stride) * N;
            CHECK(roln_encode(&m, sc, theta, q, still, NULL, z[h], none, NULL, work_of(tick_work(k))) == ROLN_OK);
            CHECK(roln_decode(&m, sc, theta, z[h], still, x, none, work_of(tick_work(k))) == ROLN_OK);
            for (i = 0; i < N; i++) terms[0] += (ld)((x[i] - q[i]) * (x[i] - q[i])) * sq / (H + 1);
        }
        for (h = 1; h <= H; h++) {
            const double *q = b->q + (first + h * b->stride) * N;
            for (i = 0; i < nu; i++)
                for (tau[i] = 0, j = 0; j < b->stride && b->tau; j++)
                    tau[i] += b->tau[(first + (h - 1) * b->stride + j) * nu + i] / b->stride;
            if (h == 1) { /* M(z1) zd1 = M(zm) v + h/2 F(zm, v) */
                for (i = 0; i < n; i++) zm[i] = (z[0][i] + z[1][i]) / 2, v[i] = (z[1][i] - z[0][i]) / step;
                CHECK(roln_terms(&m, sc, theta, zm, v, M, NULL, g, d, &T, NULL, work_of(tick_work(k))) == ROLN_OK);
                CHECK(roln_reduce(&m, sc, theta, zm, tau, tz, work_of(tick_work(k))) == ROLN_OK);
                CHECK(roln_terms(&m, sc, theta, z[1], v, M1, NULL, NULL, NULL, NULL, NULL, work_of(tick_work(k))) == ROLN_OK);
                for (i = 0; i < n; i++) {
                    const double was = zm[i];
                    double kin = 0;
                    for (s = 1; s <= 8; s++) {
                        zm[i] = was + (s % 2 ? 1 : -1) * ((s + 1) / 2) * 4e-3;
                        CHECK(roln_terms(&m, sc, theta, zm, v, NULL, NULL, NULL, NULL, &T, NULL, work_of(tick_work(k))) == ROLN_OK);
                        kin += (s % 2 ? 1 : -1) * c[(s - 1) / 2] * T / 4e-3;
                    }
                    zm[i] = was;
                    for (p[i] = 0, j = 0; j < n; j++) p[i] += M[i * n + j] * v[j];
                    p[i] += step / 2 * (kin - g[i] - d[i] + tz[i]);
                }
                CHECK(roln_chol(n, M1, M1) == ROLN_OK);
                roln_solve_lower(n, M1, p, p), roln_solve_lower_t(n, M1, p, v);
                memcpy(zm, z[1], sizeof zm);
                continue;
            }
            CHECK(roln_step(&m, sc, theta, zm, v, b->tau ? tau : NULL, step, work_of(tick_work(k))) == ROLN_OK);
            CHECK(roln_decode(&m, sc, theta, zm, v, x, none, work_of(tick_work(k))) == ROLN_OK);
            for (i = 0; i < n; i++) terms[3] += (ld)((zm[i] - z[h][i]) * (zm[i] - z[h][i])) / (H - 1);
            for (i = 0; i < N; i++) terms[6] += (ld)((x[i] - q[i]) * (x[i] - q[i])) * sq / (H - 1);
        }
    }
}
#endif

static void test_gradient(int k, int kind)
{
    static data d;
    static roln_real theta[MAXP], g[MAXP], g1[MAXP], t[TERMS], t1[TERMS], sum[MAXP];
    static double ref[MAXP], tref[TERMS];
    const int params = models[k].params;
    uint64_t s = (uint64_t)(10 * k + kind);
    ld slow[TERMS], top = 0, e = 0, amp = 1;
    int i, w;
    parameters(k, &s, theta);
    make(k, kind, 3, &s, &d);
    if (POS(kind)) amp = (ld)scale.t / (ld)step; /* a velocity is a difference of positions over h */
    CHECK(params <= MAXP && grad_of(k, &scale, theta, &d.b, 16, g, t) == ROLN_OK);
    for (i = 0; i < params; i++) top = fabsl((ld)g[i]) > top ? fabsl((ld)g[i]) : top;

    /* the loss itself */
#ifdef ROLN_DOUBLE
    if (ACC(kind)) slow_loss_acc(k, &scale, theta, &d.b, slow);
    if (POS(kind)) slow_loss_positions(k, &scale, theta, &d.b, slow);
#endif
    if (kind < 2) slow_loss(k, &scale, theta, &d.b, slow);
    for (i = 0; i < TERMS && (kind < 2 || sizeof(roln_real) == 8); i++) {
        if (kind < 2) WORST(0, fabsl((ld)t[i] - slow[i]) / ((slow[i] + EPS) * EPS), 100);
        else CHECK_NEAR(t[i], slow[i], 1e-8L * slow[i] + 1e-20L);
        CHECK((t[i] != 0) == (POS(kind) ? i % 3 == 0 && i < 9 : ACC(kind) ? i < 3 || i == 5 || i >= 8 : i % 3 < 2 && i < 9) || models[k].md->ae.layers == 0);
    }

    /* every parameter: central differences in double, the double gradient in float */
#ifdef ROLN_DOUBLE
    (void)ref, (void)tref;
    for (i = 0; i < params; i++) {
        const int j = mate(k, i);
        const double x = theta[i], h = 3e-4, shift[4] = {h, -h, 2 * h, -2 * h};
        double l[4];
        if (kind && i % 3 != kind % 3) continue; /* every one of kind 0, every third of the others */
        for (w = 0; w < 4; w++) {
            theta[i] = theta[j] = x + shift[w];
            CHECK(grad_of(k, &scale, theta, &d.b, 16, g1, t1) == ROLN_OK);
            l[w] = weighted(t1);
        }
        theta[i] = theta[j] = x;
        l[0] = (8 * (l[0] - l[1]) - (l[2] - l[3])) / (12 * h);
        WORST(1, fabsl((ld)(g[i] + (i == j ? 0 : g[j])) - (ld)l[0]) / top, 1e-8);
    }
#else
    (void)weighted;
    test_roln_reference(k, kind, ref, tref);
    for (i = 0; i < params; i++) WORST(1, fabsl((ld)g[i] - (ld)ref[i]) / (top * EPS), 160 * amp);
    for (i = 0; i < TERMS; i++) WORST(2, fabsl((ld)t[i] - (ld)tref[i]) / (((ld)tref[i] + EPS) * EPS), 80 * amp);
#endif

    /* blocks of one, two, sixteen; three windows are the sum of single ones, bit for bit */
    for (w = 1; w <= 2; w++) {
        CHECK(grad_of(k, &scale, theta, &d.b, w, g1, t1) == ROLN_OK);
        for (i = 0; i < params; i++) e = fabsl((ld)g1[i] - (ld)g[i]) > e ? fabsl((ld)g1[i] - (ld)g[i]) : e;
        for (i = 0; i < TERMS; i++) CHECK_NEAR(t1[i], t[i], 20 * EPS * (ld)t[i]);
        if (w == 1) memcpy(sum, g1, sizeof sum);
    }
    WORST(3, e / (top * EPS), 12 * amp);
    {
        roln_loss loss;
        roln_real windows = 0;
        memset(g1, 0, sizeof g1), memset(&loss, 0, sizeof loss);
        for (w = 0; w < 3; w++) {
            roln_batch b = d.b;
            const int len = b.steps * b.stride + 1, skip = d.b.start ? d.b.start[w] : w * len;
            b.count = 1, b.start = NULL, b.q += skip * N_OF(k);
            if (b.qd) b.qd += skip * N_OF(k);
            if (b.qdd) b.qdd += skip * N_OF(k);
            if (b.tau) b.tau += skip * F_OF(k);
            CHECK(roln_grad(models[k].md, &scale, theta, &weights, &b, ACC(kind), 16, step, g1, &loss, &windows, room) == ROLN_OK);
        }
        CHECK(windows == 3);
        for (i = 0, w = 0; i < params; i++) w += g1[i] != sum[i];
        CHECK(w == 0);
        for (e = 0, i = 0; i < params; i++) e = fabsl((ld)g1[i] - (ld)g[i]) > e ? fabsl((ld)g1[i] - (ld)g[i]) : e;
        CHECK_BELOW(e / (top * EPS), 12 * amp);
    }

    /* units: powers of two, so the unit-scale model on scaled data gives the same bits */
    {
        static const roln_scale unit = {1, 1};
        static data u;
        const roln_real q = scale.q, c = scale.t;
        u = d, u.b.q = u.q, u.b.qd = d.b.qd ? u.qd : NULL, u.b.qdd = d.b.qdd ? u.qdd : NULL, u.b.tau = d.b.tau ? u.tau : NULL;
        for (i = 0; i < MAXD; i++) u.q[i] /= q, u.qd[i] *= c / q, u.qdd[i] *= c * c / q, u.tau[i] *= q * c * c;
        memset(g1, 0, sizeof g1), memset(t1, 0, sizeof t1);
        {
            roln_loss loss;
            roln_real windows = 0;
            memset(&loss, 0, sizeof loss);
            CHECK(roln_grad(models[k].md, &unit, theta, &weights, &u.b, ACC(kind), 16, step / c, g1, &loss, &windows, room) == ROLN_OK);
            memcpy(t1, &loss, sizeof loss);
        }
        CHECK(memcmp(g1, g, (size_t)params * sizeof *g) == 0 && memcmp(t1, t, sizeof t) == 0);
    }
}

/* Weights of zero switch terms off: the gradient is linear in the weights, one term at a time. */
static void test_weights(void)
{
    static data d;
    static roln_real theta[MAXP], g[MAXP], all[MAXP], t[TERMS];
    uint64_t s = 5;
    int kind, k, i;
    parameters(0, &s, theta);
    for (kind = 0; kind < 5; kind += 2) {
        ld e = 0, top = 0;
        make(0, kind, 3, &s, &d);
        CHECK(grad_of(0, &scale, theta, &d.b, 16, all, t) == ROLN_OK);
        memset(g, 0, sizeof g);
        for (k = 0; k < TERMS; k++) {
            roln_real w[TERMS] = {0}, windows = 0;
            roln_loss one, loss;
            memcpy(w, &weights, sizeof w);
            for (i = 0; i < TERMS; i++) w[i] = i == k ? w[i] : 0;
            memcpy(&one, w, sizeof w), memset(&loss, 0, sizeof loss);
            CHECK(roln_grad(models[0].md, &scale, theta, &one, &d.b, kind == 2, 16, step, g, &loss, &windows, room) == ROLN_OK);
        }
        for (i = 0; i < ma_theta_size; i++) {
            top = fabsl((ld)all[i]) > top ? fabsl((ld)all[i]) : top;
            e = fabsl((ld)all[i] - (ld)g[i]) > e ? fabsl((ld)all[i] - (ld)g[i]) : e;
        }
        CHECK_BELOW(e / (top * EPS), 40);
    }
}

/* Positions that the model itself made with the midpoint rule, any damping, forces and layers: no prediction error, at H = 2
   and more; and none of it without forces, or where one position is off. Windows of H < 2 only reconstruct. */
static void test_own_positions(int k)
{
    enum { H = 5 };
    static data d;
    static roln_real theta[MAXP], g[MAXP], g1[MAXP], t[TERMS], t1[TERMS], w[400];
    static const roln_loss recon = {1, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    roln_model m = *models[k].md;
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    roln_real z[16], zd[16], qd[16], windows = 0;
    uint64_t s = 110 + (uint64_t)k;
    ld off;
    int h, i, size;
    m.scheme = ROLN_MIDPOINT;
    parameters(k, &s, theta);
    CHECK(roln_ae_init(&m.ae, theta, &s, w) == ROLN_OK);
    make(k, 4, 1, &s, &d);
    dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.25), &s, zd), dyadic((H + 1) * nu, k == 3 ? ROLN_C(0.0009765625) : ROLN_C(0.25), &s, d.tau);
    for (h = 0; h <= H; h++) {
        CHECK(roln_decode(&m, &scale, theta, z, zd, d.q + h * N, qd, work_of(tick_work(k))) == ROLN_OK);
        if (h < H) CHECK(roln_step(&m, &scale, theta, z, zd, d.tau + h * nu, step, work_of(tick_work(k))) == ROLN_OK);
    }
    d.b.stride = 1, d.b.tau = d.tau, d.b.start = NULL, d.b.qd = NULL, d.b.count = 1;
    for (d.b.steps = H; d.b.steps >= 2; d.b.steps--) {
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t) == ROLN_OK);
        /* positions are good to eps |q|, velocities to eps |q| / h, and the steps multiply that by H: (64 H 300 eps)^2 */
        off = k == 3 ? 1e10L : 1;
        WORST(8, ((ld)t[3] + (ld)t[6]) / (EPS * EPS) / (off * 1e10L), 1);
    }
    d.b.steps = H;
    if (k != 3) { /* a wrong force, a wrong position */
        d.tau[nu] += 1;
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t1) == ROLN_OK);
        CHECK((ld)t1[3] > PICK(4, 1000) * (ld)t[3]);
        d.tau[nu] -= 1, d.q[2 * N] += ROLN_C(0.0078125);
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t1) == ROLN_OK);
        CHECK(t1[3] > ROLN_C(1e-7));
    }
    for (d.b.steps = 1; d.b.steps >= 0; d.b.steps--) {
        roln_loss loss;
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t) == ROLN_E_LENGTH);
        for (i = 0; i < models[k].params; i++) CHECK(g[i] <= 0 && g[i] >= 0);
        memset(g1, 0, sizeof g1), memset(&loss, 0, sizeof loss);
        CHECK(roln_grad(models[k].md, &scale, theta, &recon, &d.b, 0, 16, step, g1, &loss, &windows, work_of(grad_work(k, 16, 1))) == ROLN_OK);
        size = roln_ae_params(&m.ae);
        for (i = size; i < models[k].params; i++) CHECK(g1[i] <= 0 && g1[i] >= 0);
        CHECK(loss.z <= 0 && loss.q_pred <= 0);
    }
    d.b.steps = 0; /* the acceleration loss and the errors need velocities */
    {
        roln_loss loss;
        roln_error e[1];
        memset(&loss, 0, sizeof loss);
        CHECK(roln_grad(models[k].md, &scale, theta, &recon, &d.b, 1, 16, step, g1, &loss, &windows, work_of(grad_work(k, 16, 1))) == ROLN_E_LENGTH);
        CHECK(roln_errors(models[k].md, &scale, theta, &d.b, 16, step, 1, d.q, e, work_of(grad_work(k, 16, 1))) == ROLN_E_LENGTH);
    }
}

/* Variance of the data of every term, slowly; and the loss in parts of it, whatever the scale. */
static void test_variance(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const int N = N_OF(k), n = n_OF(k);
    uint64_t s = 120 + (uint64_t)k;
    int kind, w, i, j;
    parameters(k, &s, theta);
    for (kind = 0; kind < KINDS; kind++) {
        static roln_real x[8][96];
        roln_real got[TERMS], was[TERMS];
        ld var[6];
        make(k, kind, 6, &s, &d);
        for (w = 0; w < 6; w++) {
            const int at = (d.b.start ? d.b.start[w] : w * (d.b.steps * d.b.stride + 1)) * N;
            memcpy(x[w], d.q + at, (size_t)N * sizeof **x), memcpy(x[w] + 16, d.qd + at, (size_t)N * sizeof **x);
            memcpy(x[w] + 32, d.qdd + at, (size_t)N * sizeof **x);
            CHECK(roln_encode(models[k].md, &scale, theta, x[w], x[w] + 16, x[w] + 32, x[w] + 48, x[w] + 64, x[w] + 80, work_of(tick_work(k))) == ROLN_OK);
        }
        for (j = 0; j < 6; j++)
            for (var[j] = 0, i = 0; i < (j < 3 ? N : n); i++) {
                const ld unit = (j < 3 ? 1 / (ld)scale.q : 1) * powl((ld)scale.t, j % 3);
                ld mean = 0, sum = 0;
                for (w = 0; w < 6; w++) mean += (ld)x[w][16 * j + i] / 6;
                for (w = 0; w < 6; w++) sum += ((ld)x[w][16 * j + i] - mean) * ((ld)x[w][16 * j + i] - mean) / 6;
                var[j] += sum * unit * unit;
            }
        for (j = 0; j < 3; j++) /* no data: 1 */
            if ((j == 1 && !d.b.qd) || (j == 2 && !d.b.qdd)) var[j] = var[3 + j] = 1;
        CHECK(roln_variance(models[k].md, &scale, theta, &d.b, (roln_loss *)got, work_of(grad_work(k, 1, 0))) == ROLN_OK && WORK_KEPT());
        for (i = 0; i < TERMS; i++) {
            j = i < 6 ? i : i - 6;
            CHECK_NEAR(got[i], i == 9 ? 1 : var[j], 200 * EPS * (i == 9 ? 1 : var[j])); /* of the force: 1 */
        }
        memcpy(was, &weights, sizeof was);
        roln_loss_divide((roln_loss *)was, (const roln_loss *)got);
        for (i = 0; i < TERMS; i++) CHECK_NEAR(was[i] * got[i], ((const roln_real *)&weights)[i], 4 * EPS);
        memcpy(was, got, sizeof got);
        for (i = 0; i < 4; i++) { /* untouched: NaN, infinity, data at rest, no windows */
            d.b.count = i == 3 ? 0 : 6;
            if (i < 2) d.q[(d.b.start ? d.b.start[0] : 0) * N] = (roln_real)(i ? INFINITY : NAN);
            if (i == 2) memset(d.q, 0, sizeof d.q);
            CHECK(roln_variance(models[k].md, &scale, theta, &d.b, (roln_loss *)got, work_of(grad_work(k, 1, 0))) == ROLN_E_NOT_FINITE);
            CHECK(memcmp(was, got, sizeof got) == 0);
        }
    }
    if (k == 4) { /* a linear autoencoder, the same in other units: slope 1, biases along */
        static const roln_scale other = {8, ROLN_C(0.125)};
        roln_loss var[2], loss[2], part[2];
        static roln_real g[MAXP];
        roln_real windows = 0;
        make(k, 0, 6, &s, &d);
        d.b.steps = 0;
        for (i = 0; i < 2; i++) {
            const roln_scale *sc = i ? &other : &scale;
            if (i)
                for (j = 2 * N; j < 3 * N; j++) theta[j] *= scale.q / other.q;
            memset(loss + i, 0, sizeof *loss), part[i] = weights;
            CHECK(roln_variance(models[k].md, sc, theta, &d.b, var + i, work_of(grad_work(k, 1, 0))) == ROLN_OK);
            CHECK(roln_grad(models[k].md, sc, theta, &weights, &d.b, 0, 16, step, g, loss + i, &windows, work_of(grad_work(k, 16, 0))) == ROLN_OK);
            roln_loss_divide(part + i, var + i);
        }
        CHECK(loss[0].q > 2 * loss[1].q && loss[0].qd > 2 * loss[1].qd);
        CHECK_NEAR(roln_loss_total(part, loss) / roln_loss_total(part + 1, loss + 1), 1, 20 * EPS);
    }
}

/* ---- prediction ---- */

static void test_rollout(void)
{
    enum { STEPS = 60 };
    static roln_real theta[MAXP], q[(STEPS + 1) * 6], qd[(STEPS + 1) * 6], tau[STEPS * 6], qp[(STEPS + 1) * 6], qdp[(STEPS + 1) * 6];
    const roln_real h = PICK(ROLN_C(0.015625), 0.00390625), NONE = 7;
    roln_real z[2], zd[2], x[6], xd[6], tz[2], T, V;
    uint64_t s = 60;
    ld E0 = 0, W = 0, P, moved = 0;
    int k, i, again;
    parameters(0, &s, theta);
    dyadic(6, 1, &s, tau);
    dyadic(2, 1, &s, z), dyadic(2, 1, &s, zd);
    for (k = 0; k <= 200; k++) { /* energy = work of the force, Simpson */
        CHECK(roln_terms(&ma_model, &scale, theta, z, zd, NULL, NULL, NULL, NULL, &T, &V, work_of(tick_work(0))) == ROLN_OK);
        CHECK(roln_reduce(&ma_model, &scale, theta, z, tau, tz, work_of(tick_work(0))) == ROLN_OK);
        P = (ld)tz[0] * (ld)zd[0] + (ld)tz[1] * (ld)zd[1];
        if (k == 0) E0 = (ld)T + (ld)V;
        W += (ld)h * P * (k == 0 || k == 200 ? 1 : k % 2 ? 4 : 2) / 3;
        moved += fabsl(P) * (ld)h;
        if (k < 200) CHECK(roln_step(&ma_model, &scale, theta, z, zd, tau, h, work_of(tick_work(0))) == ROLN_OK);
    }
    WORST(5, fabsl((ld)T + (ld)V - E0 - W) / moved, PICK(4e-6, 1e-8));
    CHECK(fabsl((ld)T + (ld)V - E0) > 0.05L * moved);

    dyadic((STEPS + 1) * 6, 1, &s, q), dyadic((STEPS + 1) * 6, 1, &s, qd), dyadic(STEPS * 6, 1, &s, tau);
    for (again = 0; again < 4; again++) { /* predict = encode, step, decode */
        CHECK(roln_predict(&ma_model, &scale, theta, STEPS, h, again, q, qd, again == 1 ? NULL : tau, qp, qdp, work_of(tick_work(0))) == ROLN_OK);
        CHECK(WORK_KEPT());
        for (k = 0; k <= STEPS; k++) {
            if (k == 0 || (again && k % again == 0)) CHECK(roln_encode(&ma_model, &scale, theta, q + 6 * k, qd + 6 * k, NULL, z, zd, NULL, room) == ROLN_OK);
            else CHECK(roln_step(&ma_model, &scale, theta, z, zd, again == 1 ? NULL : tau + 6 * (k - 1), h, room) == ROLN_OK);
            CHECK(roln_decode(&ma_model, &scale, theta, z, zd, x, xd, room) == ROLN_OK);
            CHECK(memcmp(x, qp + 6 * k, sizeof x) == 0 && memcmp(xd, qdp + 6 * k, sizeof x) == 0);
        }
    }
    q[6 * 30 + 2] = (roln_real)NAN; /* fails at 30 of every third, the samples before are there */
    for (i = 0; i < (STEPS + 1) * 6; i++) qp[i] = qdp[i] = NONE;
    CHECK(roln_predict(&ma_model, &scale, theta, STEPS, h, 3, q, qd, tau, qp, qdp, room) == ROLN_E_NOT_FINITE);
    for (i = 0; i < (STEPS + 1) * 6; i++) CHECK((qp[i] != NONE) == (i < 180) && (qdp[i] != NONE) == (i < 180));
    CHECK(roln_predict(&ma_model, &scale, theta, STEPS, h, 0, q, qd, tau, qp, qdp, room) == ROLN_OK);
    tau[6 * 9] = (roln_real)INFINITY;
    CHECK(roln_predict(&ma_model, &scale, theta, STEPS, h, 0, q, qd, tau, qp, qdp, room) == ROLN_E_NOT_FINITE);
}

static void test_errors(int k)
{
    static data d;
    static roln_real theta[MAXP], qp[MAXD], qdp[MAXD], sums[40], qbar[16];
    const int N = N_OF(k), H = models[k].horizon;
    uint64_t s = 70;
    int w, h, i, every, nb;
    parameters(k, &s, theta);
    make(k, 0, 5, &s, &d);
    for (i = 0; i < MAXD; i++) d.qd[i] /= 8, d.tau[i] /= 8;
    dyadic(N, 1, &s, qbar);
    for (every = 1; every <= 2; every++)
        for (nb = 1; nb <= 16; nb += 3) {
            ld ref[40] = {0};
            memset(sums, 0, sizeof sums);
            CHECK(roln_errors(models[k].md, &scale, theta, &d.b, nb, step, every, qbar, (roln_error *)sums, work_of(grad_work(k, nb, 0))) == ROLN_OK);
            CHECK(WORK_KEPT());
            for (w = 0; w < 5; w++) {
                const int at = w * (H + 1) * N;
                CHECK(roln_predict(models[k].md, &scale, theta, H, step, 0, d.q + at, d.qd + at, d.tau + w * (H + 1) * F_OF(k), qp, qdp, room) == ROLN_OK);
                for (h = 0; h <= H; h += every)
                    for (i = 0; i < N; i++) {
                        const ld q = (ld)d.q[at + h * N + i], qd = (ld)d.qd[at + h * N + i], e = (ld)qp[h * N + i] - q, f = (ld)qdp[h * N + i] - qd;
                        ref[4 * (h / every)] += e * e, ref[4 * (h / every) + 1] += (q - (ld)qbar[i]) * (q - (ld)qbar[i]);
                        ref[4 * (h / every) + 2] += f * f, ref[4 * (h / every) + 3] += qd * qd;
                    }
            }
            for (i = 0; i < 40; i++) CHECK_NEAR(sums[i], ref[i], 60 * EPS * (ref[i] + (k == 1 ? 1 : 0)));
        }
}

/* A block that fails adds nothing: NaN and infinity in every number of the second window, nb = 1. */
static void test_grad_failures(int k, int kind)
{
    static data d;
    static roln_real theta[MAXP], g[MAXP], first[MAXP], t[TERMS];
    const int N = N_OF(k), len = models[k].horizon * !ACC(kind) * (kind % 2 + 1) + 1;
    uint64_t s = 80;
    int i, f, b;
    parameters(k, &s, theta);
    make(k, kind, 2, &s, &d);
    d.b.start = NULL;
    d.b.count = 1;
    CHECK(grad_of(k, &scale, theta, &d.b, 1, first, t) == ROLN_OK);
    d.b.count = 2;
    for (f = 0; f < 4; f++) {
        roln_real *x = f == 0 ? d.q : f == 1 ? d.qd : f == 2 ? d.qdd : d.tau;
        const int M = f == 3 ? F_OF(k) : N;
        if ((f == 1 && POS(kind)) || (f == 2 && !ACC(kind)) || (f == 3 && (!d.b.tau || kind == 3))) continue; /* kind 3: the windows share forces */
        for (i = len * M; i < (2 * len - (f == 3 && !ACC(kind))) * M; i++)
            for (b = 0; b < 2; b++) {
                const roln_real was = x[i];
                if (kind % 2 && !ACC(kind) && (i / M - len) % 2) continue; /* skipped by the stride */
                x[i] = (roln_real)(b ? NAN : INFINITY);
                CHECK(grad_of(k, &scale, theta, &d.b, 1, g, t) == ROLN_E_NOT_FINITE);
                CHECK(memcmp(g, first, (size_t)models[k].params * sizeof *g) == 0);
                x[i] = was;
            }
    }
    for (i = 0; i < models[k].params; i++) { /* so does a broken parameter, whether it matters or not */
        const roln_real was = theta[i];
        theta[i] = (roln_real)NAN;
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t) == ROLN_E_NOT_FINITE);
        for (f = 0, b = 0; b < models[k].params; b++) f += g[b] != 0;
        CHECK(f == 0);
        theta[i] = was;
    }
}

/* ---- packed and written parameters ---- */

static void random_bits(int n, uint64_t *s, roln_real *x)
{
    while (n > 0) {
        const uint64_t r = roln_rand(s);
        memcpy(x, &r, sizeof *x);
        if (roln_finite(*x)) x++, n--;
    }
}

static void test_pack(int k)
{
    static roln_real theta[MAXP], t2[MAXP], zero[MAXP];
    static unsigned char bytes[16000], bad[16000];
    const roln_model *m = models[k].md;
    const roln_lnn *f = &m->lnn;
    const int total = models[k].packed, n = n_OF(k), sizes = 8 + m->ae.layers + f->mass.layers + 2 * f->layers, lead = 8 + 2 * sizes;
    const int R = (int)sizeof(roln_real), numbers = 5 + 3 * n + models[k].params;
    roln_scale sc = {ROLN_C(0.3), ROLN_C(0.7)}, s2;
    roln_real range[24], range2[24], d2;
    const roln_numbers x = {&sc, &dt, range, range + n, range + 2 * n, theta};
    uint64_t s = 90, sum;
    int i, j;
    CHECK(total <= 16000 - 8 && total == ROLN_PACKED(m->ae.layers, f->mass.layers, f->layers, n, models[k].params));
    random_bits(models[k].params, &s, theta), random_bits(3 * n, &s, range);
    memset(bytes, 0xa5, sizeof bytes);
    roln_pack(m, &x, bytes);
    CHECK(bytes[total] == 0xa5 && memcmp(bytes, "ROLN\2\0", 6) == 0 && bytes[6] == sizeof(roln_real) && bytes[7] == sizes);
    { /* the sizes, in this order, 16 bits each; least and slope lead the numbers */
        int want[64], c = 0;
        want[c++] = m->scheme, want[c++] = m->inputs, want[c++] = f->head + 2 * f->base + 4 * f->damping, want[c++] = m->ae.layers;
        want[c++] = f->mass.layers, want[c++] = f->layers, want[c++] = n;
        for (i = 0; i <= m->ae.layers; i++) want[c++] = m->ae.size[i];
        for (i = 1; i < f->mass.layers; i++) want[c++] = f->mass.size[i];
        for (i = 0; i <= f->layers; i++) want[c++] = f->width[i];
        for (i = 0; i < f->layers; i++) want[c++] = f->layer[i];
        CHECK(c == sizes);
        for (i = 0; i < c; i++) CHECK(bytes[8 + 2 * i] + 256 * bytes[9 + 2 * i] == want[i]);
        CHECK(memcmp(bytes + lead, &m->ae.slope, sizeof dt) == 0 && memcmp(bytes + lead + R, &f->least, sizeof dt) == 0);
    }
    memcpy(bad, bytes, sizeof bad);
#define UNPACK(p, count) roln_unpack(m, count, p, &s2, &d2, range2, range2 + n, range2 + 2 * n, t2)
#define KEPT() (s2.q == 7 && s2.t == 7 && d2 == 7 && range2[0] == 7 && memcmp(range2, range2 + 1, (size_t)(3 * n - 1) * sizeof *range2) == 0 && \
                memcmp(t2, zero, sizeof t2) == 0)
    s2.q = s2.t = d2 = 7;
    for (i = 0; i < 3 * n; i++) range2[i] = 7;
    memset(t2, 0, sizeof t2);
    for (i = 0; i < total; i++) /* every byte, two corruptions; in the leading bytes, at the edges and here and there all 255 */
        for (j = 1; j < 256; j++) {
            const roln_status want = i < 6 ? ROLN_E_FORMAT : i == 6 ? ROLN_E_PRECISION : i < lead ? ROLN_E_SHAPE : ROLN_E_CHECKSUM;
            if (i >= lead + 8 && i < total - 9 && i % 401 != 0 && j != 1 << (i % 8) && j != 255) continue;
            bad[i] ^= (unsigned char)j;
            CHECK(UNPACK(bad, total) == want);
            bad[i] = bytes[i];
        }
    CHECK(KEPT());
    for (i = 0; i <= total + 3; i++) { /* every length, in memory of that length */
        unsigned char *p = (unsigned char *)malloc((size_t)i + 1);
        if (i == total) { free(p); continue; }
        memset(p, 0, (size_t)i + 1);
        memcpy(p, bytes, (size_t)(i < total ? i : total));
        CHECK(UNPACK(p, i) == ROLN_E_LENGTH);
        free(p);
    }
    CHECK(UNPACK(bytes, -1) == ROLN_E_LENGTH && UNPACK(bytes, -2147483647) == ROLN_E_LENGTH);
    for (i = 0; i < MODELS; i++) /* bytes of another model */
        if (i != k) {
            const roln_status st = roln_unpack(models[i].md, total, bytes, &s2, &d2, range2, range2 + n, range2 + 2 * n, t2);
            CHECK(st == ROLN_E_SHAPE || (st == ROLN_E_LENGTH && total < 8 + 2 * 40));
        }
    for (i = 0; i < numbers; i++) /* numbers, under a true checksum: other slope or least, bad scales, NaN */
        for (j = 0; j < 3; j++) {
            const int at = lead + R * i, same = i < 2;
            roln_real y = (roln_real)(j == 0 ? NAN : j == 1 ? -INFINITY : -0.f);
            unsigned char *p = bad + total - 8;
            if (j == 2 && i > 3) continue;
            memcpy(bad + at, &y, sizeof y);
            sum = roln_fnv(total - 8, bad, ROLN_FNV);
            rolni_put(&p, sum, 8);
            CHECK(UNPACK(bad, total) == (same && j > 0 ? ROLN_E_SHAPE : ROLN_E_NOT_FINITE));
            memcpy(bad + at, bytes + at, sizeof y);
        }
    CHECK(KEPT());
    CHECK(UNPACK(bytes, total) == ROLN_OK);
    CHECK(s2.q == sc.q && s2.t == sc.t && d2 == dt && memcmp(t2, theta, (size_t)models[k].params * sizeof *t2) == 0);
    CHECK(memcmp(range, range2, (size_t)(3 * n) * sizeof *range) == 0);
    CHECK(roln_fnv(6, (const unsigned char *)"foobar", ROLN_FNV) == UINT64_C(0x85944171f73967e8));
}

static char text[400000];
static void put(void *ctx, const char *piece)
{
    size_t *at = (size_t *)ctx, len = strlen(piece);
    CHECK(*at + len < sizeof text);
    memcpy(text + *at, piece, len + 1);
    *at += len;
}

/* One number at *p, as the compiler would read it: [-] digits '.' [f] { (* or /) digits '.' [f] } */
static int read_real(const char **p, roln_real *x)
{
    char *end, op = 0;
    for (*x = 0;; op = *(*p)++) {
        const int sign = op == 0 && **p == '-';
        roln_real v;
        if (sign) ++*p;
        if (**p < '0' || **p > '9') return 0;
        v = (roln_real)strtod(*p, &end);
        if (end[-1] != '.' || (sizeof *x == 4 && *end++ != 'f')) return 0;
        *x = op == '*' ? *x * v : op == '/' ? *x / v : sign ? -v : v;
        *p = end;
        if (**p != '*' && **p != '/') return 1;
    }
}

static void test_write(void)
{
    static const roln_real edge[8] = {0, PICK(1e-45f, 4.9406564584124654e-324), PICK(3.4028235e38f, 1.7976931348623157e308), PICK(1.17549435e-38f, 2.2250738585072014e-308),
                                      PICK(1.1754942e-38f, 2.225073858507201e-308), 1, PICK(16777216, 9007199254740992.0), ROLN_C(0.1)};
    static ma_params p;
    roln_real x[3 + 6 + ma_theta_size], y;
    const char *at = text;
    uint64_t s = 95;
    size_t len = 0;
    int i;
    random_bits(3 + 6 + ma_theta_size, &s, x);
    for (i = 0; i < 16; i++) x[i] = i % 2 ? -edge[i / 2] : edge[i / 2];
    p.scale.q = x[0], p.scale.t = x[1], p.dt = x[2];
    memcpy(p.z_min, x + 3, sizeof p.z_min), memcpy(p.z_max, x + 5, sizeof p.z_max), memcpy(p.zd_max, x + 7, sizeof p.zd_max);
    memcpy(p.theta, x + 9, sizeof p.theta);
    CHECK(ma_write(&p, put, &len) == ROLN_OK);
    at = strstr(text, "static const ma_params ma_weights = {\n");
    CHECK(at != NULL && strcmp(text + len - 4, "}};\n") == 0);
    if (!at) return;
    at += 37;
    for (i = 0; i < 3 + 6 + ma_theta_size; i++) {
        at += strspn(at, " ,{}\n");
        CHECK(read_real(&at, &y));
        CHECK(memcmp(&y, x + i, sizeof y) == 0);
    }
    CHECK(strcmp(at, "}};\n") == 0);
    for (at = text, i = 0; *at; at++) i += (*at == '{') - (*at == '}');
    CHECK(i == 0);
}

/* ---- some of the joints, stored weights ---- */

/* What is asked for of decode, bit for bit; what is asked wrongly is refused. */
static void test_some(int k)
{
    const roln_model *m = models[k].md;
    const int N = N_OF(k), n = n_OF(k);
    static roln_real theta[MAXP];
    roln_real z[16], zd[16], q[16], qd[16], some[16], somed[16];
    uint64_t s = 130 + (uint64_t)k;
    int which[16], count, i;
    parameters(k, &s, theta), dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd);
    CHECK(roln_decode(m, &scale, theta, z, zd, q, qd, work_of(tick_work(k))) == ROLN_OK);
    for (count = 0; count <= N; count++) {
        for (i = 0; i < 16; i++) which[i] = i < count ? roln_randint(N, &s) : -1, some[i] = somed[i] = 7;
        CHECK(roln_decode_some(m, &scale, theta, z, zd, count, which, some, somed, work_of(tick_work(k))) == ROLN_OK && WORK_KEPT());
        for (i = 0; i < count; i++)
            CHECK(memcmp(some + i, q + which[i], sizeof *q) == 0 && memcmp(somed + i, qd + which[i], sizeof *q) == 0);
        for (; i < 16; i++) CHECK(some[i] == 7 && somed[i] == 7);
    }
    for (i = 0; i < 5; i++) {
        const roln_real was = z[0];
        which[0] = i == 2 ? -1 : i == 3 ? N : 0, some[0] = somed[0] = 7;
        if (i == 4) z[0] = (roln_real)NAN;
        CHECK(roln_decode_some(m, &scale, theta, z, zd, i == 0 ? -1 : i == 1 ? N + 1 : 1, which, some, somed, room) ==
              (i < 4 ? ROLN_E_LENGTH : ROLN_E_NOT_FINITE));
        CHECK(some[0] == 7 && somed[0] == 7);
        z[0] = was;
    }
}

#ifndef ROLN_DOUBLE
/* One of the small models stored: packed, every byte of it, unpacked, written. */
static void test_stored(int k, const roln_storage *store)
{
    static float theta[MAXP], st[MAXP], t2[MAXP], zero[MAXP];
    static unsigned char bytes[16000], bad[16000];
    roln_model to = *models[k].md;
    const roln_model *m = &to;
    const roln_lnn *f = &to.lnn;
    const int n = n_OF(k), lead = 8 + 2 * (8 + to.ae.layers + f->mass.layers + 2 * f->layers);
    float range[24], range2[24], d2 = 7;
    roln_scale sc = {0.3f, 0.7f}, s2 = {7, 7};
    roln_numbers x = {&sc, &dt, range, range + n, range + 2 * n, theta};
    const char *at = text;
    uint64_t s = 140 + (uint64_t)k;
    size_t len = 0;
    int params, total, i, j, nan = 0;
    to.ae.store = store, params = roln_params(m);
    total = ROLN_PACKED(to.ae.layers, f->mass.layers, f->layers, n, params);
    parameters(k, &s, theta);
    for (i = 0; i < 3 * n; i++) range[i] = i < n ? -1 : 1;
    theta[models[k].params - 1] = NAN; /* of the networks */
    memset(st, 0, sizeof st);
    CHECK(roln_store(m, &x, st, work_of(ROLN_AE_STORE_WORK(roln_ae_params(&to.ae), N_OF(k), to.ae.size[1], rolni_ae_sum(&to.ae)))) == ROLN_E_NOT_FINITE);
    CHECK(memcmp(st, zero, sizeof st) == 0);
    theta[models[k].params - 1] = 0.25f;
    CHECK(roln_store(m, &x, st, work_of(ROLN_AE_STORE_WORK(roln_ae_params(&to.ae), N_OF(k), to.ae.size[1], rolni_ae_sum(&to.ae)))) == ROLN_OK && WORK_KEPT());
    { /* nothing trains it: gradients are refused, and written nowhere */
        static data d;
        static float g[MAXP], g7[MAXP];
        static const roln_loss none = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
        const int sizes = grad_work(k, 2, models[k].horizon);
        float windows = 0, q[16], gz[16] = {0}, gv[16] = {0};
        roln_loss loss = none;
        int kind;
        for (i = 0; i < MAXP; i++) g[i] = g7[i] = 7;
        for (kind = 0; kind < KINDS; kind++) {
            make(k, kind, 2, &s, &d);
            CHECK(roln_grad(m, &sc, st, &weights, &d.b, ACC(kind), 2, step, g, &loss, &windows, work_of(sizes)) == ROLN_E_SHAPE);
        }
        CHECK(memcmp(g, g7, sizeof g) == 0 && memcmp(&loss, &none, sizeof loss) == 0 && windows == 0);
        dyadic(16, 1, &s, q);
        CHECK(roln_inertia_bwd(m, &sc, st, q, d.q, d.q, gz, gv, g, work_of(sizes)) == ROLN_E_SHAPE && memcmp(g, g7, sizeof g) == 0 && gz[0] == 0 && gv[0] == 0);
        CHECK(roln_inertia_bwd(m, &sc, st, q, d.q, d.q, gz, gv, NULL, work_of(sizes)) == ROLN_OK && gz[0] != 0 && gv[0] != 0 && WORK_KEPT());
    }
    i = roln_params(models[k].md) - roln_ae_params(&models[k].md->ae);
    CHECK(memcmp(st + params - i, theta + models[k].params - i, (size_t)i * sizeof *st) == 0);

    for (i = 0; i < params; i++) /* words that are NaN, infinite, all bits: what packed weights may look like */
        if (!roln_ae_is_number(&to.ae, i)) {
            const uint32_t w = i % 4 == 0 ? UINT32_C(0xffffffff) : i % 4 == 1 ? UINT32_C(0x7f800001) : UINT32_C(0xff800000) + (uint32_t)i;
            memcpy(st + i, &w, sizeof w), nan++;
        }
    CHECK(nan > 0 && total <= 16000);
    x.theta = st;
    roln_pack(m, &x, bytes), memcpy(bad, bytes, sizeof bad);
    CHECK(bytes[12] == f->head + 2 * f->base + 4 * f->damping + 8 * store->bits);
    memset(t2, 0, sizeof t2), memset(range2, 0, sizeof range2);
    for (i = 0; i < total; i++)
        for (j = 1; j < 256; j++) {
            const roln_status want = i < 6 ? ROLN_E_FORMAT : i == 6 ? ROLN_E_PRECISION : i < lead ? ROLN_E_SHAPE : ROLN_E_CHECKSUM;
            if (i >= lead && i % 101 != 0 && j != 1 << (i % 8)) continue;
            bad[i] ^= (unsigned char)j;
            CHECK(UNPACK(bad, total) == want);
            bad[i] = bytes[i];
        }
    for (i = 0; i < params; i++) { /* NaN under a true checksum: refused among numbers only */
        const float y = NAN;
        unsigned char *p = bad + total - 8;
        memcpy(bad + lead + 4 * (5 + 3 * n + i), &y, sizeof y);
        rolni_put(&p, roln_fnv(total - 8, bad, ROLN_FNV), 8);
        if (roln_ae_is_number(&to.ae, i)) CHECK(UNPACK(bad, total) == ROLN_E_NOT_FINITE && memcmp(t2, zero, sizeof t2) == 0);
        else CHECK(UNPACK(bad, total) == ROLN_OK), memset(t2, 0, sizeof t2);
        memcpy(bad, bytes, sizeof bad);
    }
    CHECK(roln_unpack(models[k].md, total, bytes, &s2, &d2, range2, range2 + n, range2 + 2 * n, t2) == ROLN_E_SHAPE);
    CHECK(UNPACK(bytes, total) == ROLN_OK && memcmp(t2, st, (size_t)params * sizeof *st) == 0);

    CHECK(roln_write(m, "mx", &x, put, &len) == ROLN_OK); /* all numbers as words, in the order of NAME_params */
    at = strstr(text, "*/\nROLN_FLASH static const mx_words mx_flash = {{\n");
    CHECK(at != NULL && strcmp(text + len - strlen("\n}};\n#define mx_weights mx_flash.params\n"), "\n}};\n#define mx_weights mx_flash.params\n") == 0);
    if (!at) return;
    at = strchr(at, '{') + 2;
    for (i = 0; i < 3 + 3 * n + params; i++) {
        const float *from = i < 1 ? &sc.q : i < 2 ? &sc.t : i < 3 ? &dt : i < 3 + 3 * n ? range + i - 3 : st + i - 3 - 3 * n;
        uint32_t want;
        char *end;
        memcpy(&want, from, sizeof want);
        at += strspn(at, " \n");
        CHECK(strtoul(at, &end, 16) == want && *end == ',');
        at = end + 1;
    }
    CHECK(*at == '\n' && at[1] == '}');
    for (i = 0; i < params && !roln_ae_is_number(&to.ae, i); i++) {}
    len = 0, st[i] = INFINITY;
    CHECK(roln_write(m, "mx", &x, put, &len) == ROLN_E_NOT_FINITE && len == 0);
}

/* The typed way: bytes of the full model, stored; it then encodes, decodes, steps as the full one does, nearly. */
static void test_stored_shell(void)
{
    static ma_params p;
    static ms_params a, b;
    static ms_words words;
    static ma_start init;
    static ma_work work;
    static ms_work wa;
    static ms_start start;
    static unsigned char full[ma_packed_size], bytes[ms_packed_size];
    static const int which[3] = {5, 0, 2};
    float q[24], qd[24], some[3], somed[3], A[16], B[24], up[4], down[4];
    ma_state x;
    ms_state y, back;
    ma_latent s;
    ms_latent t, u;
    uint64_t seed = 11;
    int i, j;
    CHECK(ma_init(&p, &seed, &init) == ROLN_OK);
    dyadic(24, 1, &seed, q), dyadic(24, 1, &seed, qd);
    ma_pack(&p, full);
    memset(&b, 7, sizeof b), a = b;
    CHECK(ms_store(ma_packed_size, full, &a, &start) == ROLN_E_RANGE && memcmp(&a, &b, sizeof a) == 0); /* no range yet */
    CHECK(ma_fit_range(&p, 4, q, qd, &work) == ROLN_OK);
    p.dt = dt;
    ma_pack(&p, full);
    CHECK(ms_store(ma_packed_size - 1, full, &a, &start) == ROLN_E_LENGTH);
    full[300] ^= 1;
    CHECK(ms_store(ma_packed_size, full, &a, &start) == ROLN_E_CHECKSUM && memcmp(&a, &b, sizeof a) == 0);
    full[300] ^= 1;
    CHECK(ms_store(ma_packed_size, full, &a, &start) == ROLN_OK && (int)ms_packed_size < (int)ma_packed_size);
    CHECK(memcmp(&a.scale, &p.scale, sizeof a.scale) == 0 && memcmp(&a.dt, &p.dt, sizeof a.dt) == 0);
    CHECK(memcmp(a.z_min, p.z_min, sizeof a.z_min) == 0 && memcmp(a.z_max, p.z_max, sizeof a.z_max) == 0 && memcmp(a.zd_max, p.zd_max, sizeof a.zd_max) == 0);
    ms_pack(&a, bytes);
    CHECK(ms_unpack(ms_packed_size, bytes, &b) == ROLN_OK && memcmp(&a, &b, sizeof a) == 0);
    CHECK(ms_store(ms_packed_size, bytes, &b, &start) != ROLN_OK && memcmp(&a, &b, sizeof a) == 0); /* stored already */
    CHECK(sizeof words == sizeof a && ms_theta_size == roln_params(&ms_model) && (int)ms_full_size == (int)ma_theta_size);
    words.params = a; /* as flash holds it */
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd), memcpy(&y, &x, sizeof y);
    CHECK(ma_encode(&p, &x, &s, &work) == ROLN_OK && ms_encode(&words.params, &y, &t, &wa) == ROLN_OK);
    for (i = 0; i < 2; i++) CHECK_NEAR(t.z[i], s.z[i], 0.02), CHECK_NEAR(t.zd[i], s.zd[i], 0.04);
    CHECK(ma_decode(&p, &s, &x, &work) == ROLN_OK && ms_decode(&a, &t, &y, &wa) == ROLN_OK);
    for (i = 0; i < 6; i++) CHECK_NEAR(y.q[i], x.q[i], 0.03), CHECK_NEAR(y.qd[i], x.qd[i], 0.06);
    CHECK(ms_encode(&a, &y, &u, &wa) == ROLN_OK);
    for (i = 0; i < 2; i++) CHECK_NEAR(u.z[i], t.z[i], 1e-3), CHECK_NEAR(u.zd[i], t.zd[i], 1e-3);
    CHECK(ms_decode_some(&a, &t, 3, which, some, somed, &wa) == ROLN_OK);
    for (i = 0; i < 3; i++) CHECK(some[i] == y.q[which[i]] && somed[i] == y.qd[which[i]]);
    { /* linearisation of a step under torques against differences */
        static ms_linwork lin;
        const float h = 1.f / 64;
        u = t;
        CHECK(ms_linear(&a, &u, q, dt, A, B, &lin) == ROLN_OK);
        for (j = 0; j < 6; j++) {
            memcpy(back.q, q, sizeof back.q);
            back.q[j] = q[j] + h, u = t, CHECK(ms_step(&a, &u, back.q, dt, &wa) == ROLN_OK), memcpy(up, &u, sizeof up);
            back.q[j] = q[j] - h, u = t, CHECK(ms_step(&a, &u, back.q, dt, &wa) == ROLN_OK), memcpy(down, &u, sizeof down);
            for (i = 0; i < 4; i++) CHECK_NEAR(B[6 * i + j], (up[i] - down[i]) / (2 * h), 2e-4);
        }
    }
}
#endif

/* ---- data, sizes, training ---- */

static void test_data(void)
{
    static const roln_scale unit = {1, 1};
    int index[100], seen[100] = {0}, again[100], orders[6] = {0}, i;
    uint64_t s = 1, r = 1;
    roln_real q[60], qd[60], still[60], bar[6], lo[2], hi[2], top[2], theta[MAXP];
    roln_scale sc = {7, 7};
    ld m[6] = {0}, sq = 0, sv = 0;
    for (i = 0; i < 100; i++) index[i] = again[i] = i;
    roln_shuffle(100, index, &s), roln_shuffle(100, again, &r);
    CHECK(memcmp(index, again, sizeof index) == 0 && s == r);
    for (i = 0; i < 100; i++) seen[index[i]]++;
    for (i = 0; i < 100; i++) CHECK(seen[i] == 1);
    for (i = 0; i < 6000; i++) { /* every order of three equally often */
        int t[3] = {0, 1, 2};
        roln_shuffle(3, t, &s);
        orders[2 * t[0] + (t[1] > t[2])]++;
    }
    for (i = 0; i < 6; i++) CHECK_NEAR(orders[i], 1000, 150);
    i = 5, roln_shuffle(0, &i, &s), roln_shuffle(1, &i, &s), CHECK(i == 5);

    dyadic(60, 3, &s, q), dyadic(60, 5, &s, qd);
    CHECK(roln_fit_scale(&ma_model, 10, q, qd, bar, &sc) == ROLN_OK);
    for (i = 0; i < 60; i++) m[i % 6] += (ld)q[i] / 10;
    for (i = 0; i < 60; i++) sq += ((ld)q[i] - m[i % 6]) * ((ld)q[i] - m[i % 6]) / 10, sv += (ld)qd[i] * (ld)qd[i] / 10;
    for (i = 0; i < 6; i++) CHECK_NEAR(bar[i], m[i], 20 * EPS);
    CHECK_NEAR(sc.q, sqrtl(sq / 2), 20 * EPS * (ld)sc.q);
    CHECK_NEAR(sc.t, sqrtl(sq / sv), 20 * EPS);
    memset(still, 0, sizeof still), sc.q = sc.t = 7;
    CHECK(roln_fit_scale(&ma_model, 10, q, still, bar, &sc) == ROLN_E_NOT_FINITE && sc.q == 7 && sc.t == 7);

    parameters(0, &s, theta);
    CHECK(roln_fit_range(&ma_model, &unit, theta, 10, q, qd, lo, hi, top, work_of(tick_work(0))) == ROLN_OK);
    for (sq = sv = m[0] = 0, i = 0; i < 10; i++) {
        roln_real z[2], zd[2];
        CHECK(roln_encode(&ma_model, &unit, theta, q + 6 * i, qd + 6 * i, NULL, z, zd, NULL, room) == ROLN_OK);
        CHECK(z[0] >= lo[0] && z[1] >= lo[1] && z[0] <= hi[0] && z[1] <= hi[1]);
        CHECK(ROLN_ABS(zd[0]) <= top[0] && ROLN_ABS(zd[1]) <= top[1]);
        m[0] += (ROLN_ABS(zd[0]) >= top[0]) + (ROLN_ABS(zd[1]) >= top[1]);
        sq += (z[0] == lo[0]) + (z[1] == lo[1]), sv += (z[0] == hi[0]) + (z[1] == hi[1]);
    }
    CHECK(sq == 2 && sv == 2 && m[0] == 2);
    CHECK(roln_fit_range(&ma_model, &unit, theta, 0, q, qd, lo, hi, top, room) == ROLN_E_LENGTH);
}

static void test_sizes(void)
{
    int k, i;
    for (k = 0; k < MODELS; k++) {
        const roln_block *t = models[k].table;
        int numbers = 0, moments = 0;
        for (i = 0; i < models[k].blocks; i++) numbers += roln_block_size(t + i), moments += roln_block_moments(t + i);
        CHECK(numbers == models[k].params && moments == models[k].moments);
        CHECK(models[k].params == roln_params(models[k].md));
        CHECK(models[k].work == tick_work(k));
        CHECK_BELOW(roln_update_work(models[k].blocks, models[k].table), models[k].update);
        CHECK(models[k].train == grad_work(k, models[k].block, models[k].horizon));
        CHECK(models[k].linear == linear_work(k));
    }
    CHECK(ma_N == 6 && ma_n == 2 && mb_N == 3 && mb_n == 3 && md_n == 2 && md_layers == 8 && ma_layers == 2 && mb_layers == 0);
    CHECK(md_mlp_layers == 6 && me_n == 1 && sizeof(ma_params) == sizeof(roln_real) * (3 + 6 + ma_theta_size));
    CHECK(ma_model.scheme == ROLN_RK4 && mb_model.scheme == ROLN_MIDPOINT && mc_model.scheme == ROLN_EULER);
}

/* Updates from real gradients keep every model on its manifolds and change every block of it; a refused one changes nothing. */
static void test_update(int k)
{
    static data d;
    static roln_real theta[MAXP], first[MAXP], was[MAXP], g[MAXP], t[TERMS], m[MAXP], v[MAXP], vm[MAXP], w[2000], L[64];
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    const roln_model *md = models[k].md;
    const roln_lnn *f = &md->lnn;
    roln_adam adam, adam_was;
    uint64_t s = 100 + (uint64_t)k;
    int round, i, j, l, p, at = 0, block = 0;
    ld e = 0;
    memset(&adam, 0, sizeof adam), memset(m, 0, sizeof m), memset(v, 0, sizeof v), memset(vm, 0, sizeof vm);
    CHECK(roln_ae_init(&md->ae, theta, &s, w) == ROLN_OK);
    roln_lnn_init(f, theta + roln_ae_params(&md->ae), &s);
    dyadic(N_OF(k) * md->inputs, 1, &s, theta + models[k].params - N_OF(k) * md->inputs);
    memcpy(first, theta, sizeof theta);
    for (round = 0; round < 6; round++) {
        make(k, round % 2 ? 0 : 2, 4, &s, &d);
        step = dt / 8;
        CHECK(grad_of(k, &scale, theta, &d.b, 16, g, t) == ROLN_OK);
        memcpy(was, theta, sizeof was), adam_was = adam;
        if (round == 3) g[models[k].params - 1] = (roln_real)NAN;
        for (i = 0; i < models[k].update + 8; i++) w[i] = 77;
        CHECK(models[k].update + 8 <= 2000 && roln_adam_update(models[k].blocks, models[k].table, &opt, 1 / (roln_real)4, g, theta, &adam,
                                                               &(roln_moments){m, v, vm}, w) == (round == 3 ? ROLN_E_NOT_FINITE : ROLN_OK));
        for (i = 0; i < 8; i++) CHECK(w[models[k].update + i] == 77);
        if (round == 3) CHECK(memcmp(was, theta, sizeof was) == 0 && memcmp(&adam, &adam_was, sizeof adam) == 0);
    }
    for (l = 0; l < md->ae.layers; l++) { /* Psi^T Phi = I; [n][N] each */
        const int N = md->ae.size[l], n = md->ae.size[l + 1];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                ld sum = -(ld)(i == j);
                for (p = 0; p < N; p++) sum += (ld)theta[at + i * N + p] * (ld)theta[at + n * N + j * N + p];
                e = fabsl(sum) > e ? fabsl(sum) : e;
            }
        at += 2 * n * N + N;
    }
    WORST(7, e / EPS, 20);
    for (i = 0; i < models[k].blocks; i++) {
        const roln_block *b = models[k].table + i;
        const int size = roln_block_size(b);
        if (size == 0) continue;
        for (j = 0; j < size && theta[block + j] == first[block + j]; j++) {}
        CHECK(j < size);
        block += size;
    }
    for (l = -1; l < f->layers; l++) { /* P and the biases of gyro layers are SPD, BiMap is orthonormal */
        const int w0 = f->width[l < 0 ? 0 : l], wo = l < 0 ? w0 : f->width[l + 1], gyro = l >= 0 && f->layer[l] == ROLN_GYRO;
        const roln_real *X = theta + roln_ae_params(&md->ae) + (l < 0 ? rolni_base_at(f) : rolni_layer_at(f, l)) + (gyro ? ROLN_TRI(w0) : 0);
        if (l < 0 ? f->base : gyro) {
            CHECK(roln_chol(w0, X, L) == ROLN_OK);
            for (i = 0; i < w0 * w0; i++) CHECK(X[i] == X[i % w0 * w0 + i / w0]);
        } else if (l >= 0 && f->layer[l] == ROLN_BIMAP)
            for (i = 0; i < wo; i++)
                for (j = 0; j < wo; j++) {
                    ld sum = 0;
                    for (p = 0; p < w0; p++) sum += (ld)X[i * w0 + p] * (ld)X[j * w0 + p];
                    CHECK_NEAR(sum, i == j, 20 * EPS);
                }
    }
}

/* Every function of the shell is the generic one with the model filled in. */
static void test_shell(void)
{
    enum { H = 3 };
    static ma_params p;
    static ma_work work;
    static ma_train train;
    static ma_gradient g, g1;
    static ma_start start;
    static const roln_loss acc = ROLN_ACC_WEIGHTS;
    roln_real q[(H + 1) * 6], qd[(H + 1) * 6], qdd[(H + 1) * 6], tau[(H + 1) * 6], a[2][(H + 1) * 6], b[2][(H + 1) * 6];
    roln_real M[2][4], c[2][2], gr[2][2], T[2], V[2];
    ma_latent s;
    roln_batch batch = {H + 1, 0, 1, NULL, NULL, NULL, NULL, NULL};
    uint64_t seed = 9;
    int i;
    CHECK(ma_init(&p, &seed, &start) == ROLN_OK);
    for (i = 0; i < (H + 1) * 6; i++) {
        q[i] = roln_normal(&seed) / 4, qd[i] = roln_normal(&seed), qdd[i] = roln_normal(&seed), tau[i] = roln_normal(&seed);
    }
    memset(b, 0, sizeof b), memset(a, 0, sizeof a);
    CHECK(ma_fit_range(&p, H + 1, q, qd, &work) == ROLN_OK);
    memcpy(s.z, p.z_min, sizeof s.z), s.zd[0] = p.zd_max[0], s.zd[1] = -p.zd_max[1];
    CHECK(ma_in_range(&p, &s));
    s.z[1] = p.z_max[1] + 1;
    CHECK(!ma_in_range(&p, &s));
    s.z[1] = (roln_real)NAN;
    CHECK(!ma_in_range(&p, &s));
    s.z[1] = p.z_max[1];
    CHECK(ma_in_range(&p, &s));
    s.zd[1] *= 1 + 4 * ROLN_EPS;
    CHECK(!ma_in_range(&p, &s));
    s.zd[1] = (roln_real)NAN;
    CHECK(!ma_in_range(&p, &s));
    s.zd[1] = -1;
    CHECK(ma_reduce(&p, &s, tau, a[0], &work) == ROLN_OK && roln_reduce(&ma_model, &p.scale, p.theta, s.z, tau, b[0], work.w) == ROLN_OK);
    CHECK(ma_lift(&p, &s, a[0], a[1], &work) == ROLN_OK && roln_lift(&ma_model, &p.scale, p.theta, s.z, b[0], b[1], work.w) == ROLN_OK);
    CHECK(memcmp(a, b, sizeof a) == 0);
    CHECK(ma_terms(&p, &s, M[0], c[0], gr[0], NULL, &T[0], &V[0], &work) == ROLN_OK);
    CHECK(roln_terms(&ma_model, &p.scale, p.theta, s.z, s.zd, M[1], c[1], gr[1], NULL, &T[1], &V[1], work.w) == ROLN_OK);
    CHECK(memcmp(M[0], M[1], sizeof M[0]) == 0 && memcmp(c[0], c[1], sizeof c[0]) == 0 && memcmp(gr[0], gr[1], sizeof gr[0]) == 0);
    CHECK(!(T[0] < T[1] || T[0] > T[1] || V[0] < V[1] || V[0] > V[1]) && ROLN_ABS(M[0][1] - M[0][2]) <= 0);
    CHECK(ma_predict(&p, H, dt, 2, q, qd, tau, a[0], a[1], &work) == ROLN_OK);
    CHECK(roln_predict(&ma_model, &p.scale, p.theta, H, dt, 2, q, qd, tau, b[0], b[1], work.w) == ROLN_OK);
    CHECK(memcmp(a, b, sizeof a) == 0);
    batch.q = q, batch.qd = qd, batch.qdd = qdd, batch.tau = tau;
    CHECK(ma_grad_acc(&p, &acc, &batch, &g, &train) == ROLN_OK);
    CHECK(roln_grad(&ma_model, &p.scale, p.theta, &acc, &batch, 1, 16, 0, g1.theta, &g1.loss, &g1.windows, train.w) == ROLN_OK);
    CHECK(memcmp(&g, &g1, sizeof g) == 0);
    CHECK_NEAR(roln_loss_total(&acc, &g.loss), g.loss.q + g.loss.qd + g.loss.qdd + g.loss.zdd + g.loss.qdd_pred, 8 * EPS * (ld)roln_loss_total(&acc, &g.loss));
}

/* Two oscillators seen through six channels; 200 updates. */
static void test_training(void)
{
    enum { SAMPLES = 400, H = 4, BATCH = 8 };
    static roln_real q[SAMPLES * 6], qd[SAMPLES * 6], qbar[6], sums[8];
    static ma_params p, was;
    static ma_optimiser o, owas;
    static ma_gradient g;
    static ma_train work;
    static ma_start init;
    static ma_work tick;
    static unsigned char bytes[ma_packed_size];
    static const roln_loss unit = ROLN_ODE_WEIGHTS;
    roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    const roln_real h = ROLN_C(0.05);
    uint64_t s = 3;
    int start[BATCH], k, i, c;
    double first = 0, last = 0;
    roln_batch b = {BATCH, H, 1, NULL, q, qd, NULL, NULL};
    ma_state x, y;
    ma_latent z;
    for (k = 0; k < SAMPLES; k++)
        for (c = 0; c < 6; c++) {
            const double a = cos(k * 0.05), v = -sin(k * 0.05), d = sin(k * 0.07 + 1), w = 1.4 * cos(k * 0.07 + 1), e = 0.1 * (c - 2.5), f = 0.3 * (c % 3 - 1);
            q[k * 6 + c] = (roln_real)(e * a + f * d + 0.1 * a * a * (c % 2)), qd[k * 6 + c] = (roln_real)(e * v + f * w + 0.2 * a * v * (c % 2));
        }
    CHECK(ma_init_pod(&p, SAMPLES, q, qd, qbar, &s, &init) == ROLN_OK);
    for (k = 0; k < 200; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, &s);
        b.start = start;
        memset(&g, 0, sizeof g);
        CHECK(ma_grad(&p, &unit, &b, h, &g, &work) == ROLN_OK);
        CHECK(ma_update(&p, &opt, &o, &g, &work) == ROLN_OK);
        if (k < 10) first += (double)(g.loss.q + g.loss.qd + g.loss.zd + g.loss.qd_pred);
        if (k >= 190) last += (double)(g.loss.q + g.loss.qd + g.loss.zd + g.loss.qd_pred);
    }
    WORST(6, (ld)(last / first), 0.1);
    /* the shell at work: failures leave everything, bytes and back, errors, range */
    was = p, owas = o;
    g.theta[5] = (roln_real)NAN;
    CHECK(ma_update(&p, &opt, &o, &g, &work) == ROLN_E_NOT_FINITE);
    memset(&g, 0, sizeof g);
    CHECK(ma_update(&p, &opt, &o, &g, &work) == ROLN_E_NOT_FINITE); /* no windows */
    CHECK(memcmp(&p, &was, sizeof p) == 0 && memcmp(&o, &owas, sizeof o) == 0);
    b.steps = H + 1;
    CHECK(ma_grad(&p, &unit, &b, h, &g, &work) == ROLN_E_LENGTH);
    b.steps = 40, b.count = 4, start[0] = 0, start[1] = 90, start[2] = 180, start[3] = 270;
    CHECK(ma_errors(&p, &b, h, 40, qbar, (roln_error *)sums, &work) == ROLN_OK);
    CHECK_BELOW(sqrt((double)(sums[4] / sums[5])), 0.9);
    CHECK(ma_fit_range(&p, SAMPLES, q, qd, &tick) == ROLN_OK && p.z_min[0] < p.z_max[0]);
    p.dt = h;
    ma_pack(&p, bytes);
    memset(&was, 0, sizeof was);
    CHECK(ma_unpack(ma_packed_size, bytes, &was) == ROLN_OK && memcmp(&p, &was, sizeof p) == 0);
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    CHECK(ma_encode(&p, &x, &z, &tick) == ROLN_OK && ma_decode(&p, &z, &y, &tick) == ROLN_OK);
    memcpy(&x, &y, sizeof x);
    CHECK(ma_encode(&p, &x, &z, &tick) == ROLN_OK && ma_decode(&p, &z, &y, &tick) == ROLN_OK); /* a projection, still */
    for (i = 0; i < 6; i++) CHECK_NEAR(x.q[i], y.q[i], 60 * EPS), CHECK_NEAR(x.qd[i], y.qd[i], 200 * EPS);
}

void TEST_NAME(roln)(void)
{
    int k, kind;
    for (k = 0; k < MODELS; k++) {
        for (kind = 0; kind < KINDS; kind++) {
            test_gradient(k, kind);
            test_grad_failures(k, kind);
        }
        test_errors(k);
        test_pack(k);
        test_update(k);
        test_own_positions(k);
        test_variance(k);
    }
    for (k = 0; k < MODELS; k++) {
        test_some(k);
#ifndef ROLN_DOUBLE
        if (models[k].md->ae.layers > 0) test_stored(k, &roln_half), test_stored(k, &roln_int8);
#endif
    }
#ifndef ROLN_DOUBLE
    test_stored_shell();
#endif
    test_weights();
    test_rollout();
    test_write();
    test_data();
    test_sizes();
    test_shell();
    test_training();
#ifdef ROLN_TEST_VERBOSE
    printf("roln " TEST_PRECISION ": loss %.1Lf eps, gradient %.2Lg, reference loss %.1Lf eps, blocks %.2Lf eps, motion %.2Lf, energy %.2Lg, loss ratio %.3Lf, constraint %.1Lf eps, own motion %.2Lg\n",
           worst[0], worst[1], worst[2], worst[3], worst[4], worst[5], worst[6], worst[7], worst[8]);
#endif
}
