/* SPDX-License-Identifier: MIT */
/* Training of joints with units of their own (ROLN_SCALE each): where these are powers of two, gradients, rows, errors and charts
   have the bits that they have for joints that were scaled by hand; where they are not, the gradient passes a slope test. How they
   are fitted, and that metres or millimetres make no difference to a training. */

#define CALLED(X) X(grad) X(grad_acc) X(rows) X(variance) X(errors) X(fit_range)
/* The small models with joints in units of their own. */
#define SMALL(name) name##_own
#define SMALL_SCALE each
#define SMALL_ROWS 4
#define SMALL_LEARN everything
#include "small_models.h"

#define ROLN_NAME rail /* a slider and a hinge */
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_HORIZON 4
#define ROLN_SCALE each
#include "roln.h"

#define ROLN_NAME alike /* the same with one unit */
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_HORIZON 4
#include "roln.h"

#define SMALL_ROWS 4
#define SMALL_LEARN everything
#include "small.h"
#include "units.h"

void TEST_NAME(units_training)(void);

/* ---- training --------------------------------------------------------------------------------- */

enum { NUMBERS = 900, COUNT = 4, ODE = 0, ACC, POSITIONS, KINDS };
typedef struct {
    roln_real q[NUMBERS], qd[NUMBERS], qdd[NUMBERS], tau[NUMBERS];
    roln_batch b;
} recording;

/* Windows of two steps of two samples; of single samples for accelerations. */
static void record(const pair *p, int kind, uint64_t *s, recording *r)
{
    const int samples = COUNT * 5;
    int i;
    CHECK(samples * p->N <= NUMBERS);
    dyadic(samples * p->N, ROLN_C(0.25), s, r->q), dyadic(samples * p->N, ROLN_C(0.25), s, r->qd);
    dyadic(samples * p->N, 1, s, r->qdd), dyadic(samples * p->F, ROLN_C(0.25), s, r->tau);
    for (i = p->N; i < samples * p->N && kind == POSITIONS; i++)
        r->q[i] = r->q[i % p->N] + r->q[i] / 64;
    memset(&r->b, 0, sizeof r->b);
    r->b.count = COUNT, r->b.steps = kind == ACC ? 0 : 2, r->b.stride = 2;
    r->b.q = r->q, r->b.qd = kind == POSITIONS ? NULL : r->qd, r->b.qdd = kind == ACC ? r->qdd : NULL, r->b.tau = r->tau;
}

static void record_in_units(const pair *p, const recording *r, recording *to)
{
    const int samples = COUNT * 5;
    in_units(p, 1, samples, r->q, to->q), in_units(p, 1, samples, r->qd, to->qd), in_units(p, 1, samples, r->qdd, to->qdd);
    force_in_units(p, samples, r->tau, to->tau);
    to->b = r->b, to->b.q = to->q, to->b.qd = r->b.qd ? to->qd : NULL;
    to->b.qdd = r->b.qdd ? to->qdd : NULL, to->b.tau = to->tau;
}

static const roln_loss every = {1, ROLN_C(0.5), ROLN_C(0.75), ROLN_C(0.625), ROLN_C(0.875), ROLN_C(0.375), ROLN_C(0.25),
                                ROLN_C(1.0625), ROLN_C(0.4375), ROLN_C(0.6875)};

/* The gradient g [GRADIENT_SIZE(params)] of a recording, from nothing; the loss is returned. */
static roln_real gradient(const instance *m, const recording *r, roln_real *g)
{
    roln_loss loss;
    fill(GRADIENT_SIZE(m->of->params), 0, g);
    if (r->b.qdd) CHECK_OK(m->of->grad_acc(m, &every, &r->b, g, room_of(m->of->scratch.grad_acc)));
    else CHECK_OK(m->of->grad(m, &every, &r->b, dt / 8, g, room_of(m->of->scratch.grad)));
    ROOM_KEPT();
    memcpy(&loss, g + m->of->params, sizeof loss);
    CHECK(g[m->of->params + GRADIENT_REST - 1] > COUNT - 1 && loss.q >= 0); /* windows */
    return roln_loss_total(&every, &loss);
}

static void test_losses(int k)
{
    static pair p;
    static recording r[2];
    static roln_real g[2][GRADIENT_SIZE(MAXP)], rows[2][COUNT * MAXP], left[2][COUNT];
    uint64_t s = 50 + (uint64_t)k;
    int kind, j;
    pair_of(k, &s, &p);
    for (kind = 0; kind < KINDS; kind++) {
        roln_loss var[2];
        roln_real loss[2];
        record(&p, kind, &s, &r[0]), record_in_units(&p, &r[0], &r[1]);
        for (j = 0; j < 2; j++) {
            const instance *m = j ? &p.own : &p.plain;
            loss[j] = gradient(m, &r[j], g[j]);
            CHECK_OK(m->of->rows(m, &every, &r[j].b, dt / 8, 5, rows[j], left[j],
                                 room_of(ROLN_MAX(m->of->scratch.grad, m->of->scratch.grad_acc))));
            CHECK_OK(m->of->variance(m, &r[j].b, &var[j], ROOM(variance)));
        }
        CHECK(same(models[k]->params, g[0], g[1]) && same(1, loss, loss + 1) && largest(models[k]->params, g[1]) > 0);
        CHECK(same(COUNT * models[k]->params, rows[0], rows[1]) && same(COUNT, left[0], left[1]));
        CHECK(memcmp(var, var + 1, sizeof *var) == 0);
    }
}

/* Those of all joints are the same, those of each are in its unit. */
static void test_errors(int k)
{
    static pair p;
    static recording r[2];
    roln_real qbar[2][MAXN], range[2][3 * MAXN];
    roln_error e[2][3], joints[2][3 * MAXN];
    uint64_t s = 60 + (uint64_t)k;
    int j, i;
    pair_of(k, &s, &p), record(&p, ODE, &s, &r[0]), record_in_units(&p, &r[0], &r[1]);
    dyadic(p.N, ROLN_C(0.25), &s, qbar[0]), in_units(&p, 1, 1, qbar[0], qbar[1]);
    for (j = 0; j < 2; j++) {
        const instance *m = j ? &p.own : &p.plain;
        CHECK_OK(m->of->errors(m, &r[j].b, dt / 8, 1, qbar[j], &(roln_errors){e[j], joints[j], NULL}, ROOM(errors)));
        ROOM_KEPT();
        CHECK_OK(m->of->fit_range(m, COUNT, r[j].q, r[j].qd, range[j], range[j] + p.n, range[j] + 2 * p.n, ROOM(fit_range)));
    }
    CHECK(memcmp(e[0], e[1], sizeof e[0]) == 0 && e[1][2].q > 0 && same(3 * p.n, range[0], range[1]));
    for (i = 0; i < 3 * p.N; i++) {
        const roln_real by = p.each[i % p.N] * p.each[i % p.N];
        const roln_error want = {joints[0][i].q * (double)by, joints[0][i].q_var * (double)by, joints[0][i].qd * (double)by,
                                 joints[0][i].qd_var * (double)by};
        CHECK(memcmp(&want, &joints[1][i], sizeof want) == 0 && want.q_var > 0);
    }
    /* in a unit that is small enough for the sums of all joints, and too small for those of the joint that has it */
    if (models[k]->md->lnn.angles & 1) return;
    p.each[0] = (roln_real)ldexp(1, sizeof(roln_real) == 4 ? 68 : 522);
    record_in_units(&p, &r[0], &r[1]), in_units(&p, 1, 1, qbar[0], qbar[1]);
    CHECK_OK(p.own.of->errors(&p.own, &r[1].b, dt / 8, 1, qbar[1], &(roln_errors){e[1], NULL, NULL}, spare));
    CHECK(p.own.of->errors(&p.own, &r[1].b, dt / 8, 1, qbar[1], &(roln_errors){e[1], joints[1], NULL}, spare) == ROLN_E_NOT_FINITE);
}

#ifdef ROLN_DOUBLE
/* Units that are no powers of two: along any direction the error of differences of the loss is quartered when the step is
   halved. */
static void test_slope(int k, int kind)
{
    static pair p;
    static recording r;
    static double g[GRADIENT_SIZE(MAXP)], unused[GRADIENT_SIZE(MAXP)], v[MAXP], theta[MAXP];
    uint64_t s = 70 + (uint64_t)(3 * k + kind);
    double off[2], along = 0;
    int half, i;
    pair_of(k, &s, &p);
    for (i = 0; i < p.N; i++)
        p.each[i] = models[k]->md->lnn.angles >> i & 1 ? 1 : 0.3 + 0.7 * i;
    record(&p, kind, &s, &r), dyadic(models[k]->params, 1, &s, v);
    for (i = 0; i < models[k]->params; i++)
        v[mate(k, i)] = v[i];
    gradient(&p.own, &r, g), memcpy(theta, p.theta, sizeof theta);
    for (i = 0; i < models[k]->params; i++)
        along += g[i] * v[i];
    for (half = 0; half < 2; half++) {
        const double h = half ? 1e-3 : 2e-3;
        double loss[2];
        int side;
        for (side = 0; side < 2; side++) {
            for (i = 0; i < models[k]->params; i++)
                p.theta[i] = theta[i] + (side ? h : -h) * v[i];
            loss[side] = gradient(&p.own, &r, unused);
        }
        off[half] = (loss[1] - loss[0]) / (2 * h) - along;
    }
    BOUND("own units: slope", fabs((4 * off[1] - off[0]) / 3) / (largest(models[k]->params, g) * 10), 1e-6);
    if (fabs(off[0]) > 1e-6 * fabs(along) && k != RUBBED && k != GANTRY) /* |g| and |y| have kinks */
        BOUND("own units: the error of differences, quartered", fabs(off[0] / off[1] - 4), 0.5);
}
#endif

/* ---- charts ----------------------------------------------------------------------------------- */

enum { FEW = 40 };

/* A bent surface in five joints, and the same with joints in units of their own. */
static void surface(uint64_t *s, const roln_real *each, roln_real *q, roln_real *qd, roln_real *Q, roln_real *Qd)
{
    int i, j;
    for (i = 0; i < FEW; i++) {
        const roln_real a = roln_normal(s), b = roln_normal(s), ad = roln_normal(s), bd = roln_normal(s);
        for (j = 0; j < 5; j++) {
            const roln_real e = ROLN_C(0.25) * (roln_real)(j + 1), f = ROLN_C(0.125) * (roln_real)(2 - j);
            q[i * 5 + j] = e * a + f * b + ROLN_C(0.0625) * a * b, qd[i * 5 + j] = e * ad + f * bd;
            Q[i * 5 + j] = each[j] * q[i * 5 + j], Qd[i * 5 + j] = each[j] * qd[i * 5 + j];
        }
    }
}

static void test_charts(void)
{
    static const roln_real each[5] = {4, ROLN_C(0.125), 2, ROLN_C(0.0625), 8};
    static chart_params p;
    static chart_refinement turn;
    static chart_chart sums;
    static chart_start start;
    static chart_own_params own;
    static chart_own_refinement own_turn;
    static chart_own_chart own_sums;
    static chart_own_start own_start;
    roln_real q[5 * FEW], qd[5 * FEW], Q[5 * FEW], Qd[5 * FEW], bar[5], left[2] = {1, 2};
    const roln_batch b = {FEW, 0, 1, NULL, q, qd, NULL, NULL}, own_b = {FEW, 0, 1, NULL, Q, Qd, NULL, NULL};
    uint64_t s = 8;
    int k;
    memset(&turn, 0, sizeof turn), memset(&own_turn, 0, sizeof own_turn), memset(&sums, 0, sizeof sums);
    memset(&own_sums, 0, sizeof own_sums);
    surface(&s, each, q, qd, Q, Qd);
    CHECK_OK(chart_init_pod(&p, FEW, q, qd, bar, &s, &start.init_pod));
    CHECK_OK(chart_own_init(&own, &s, &own_start.init));
    CHECK(all(5, own.each, 1));
    own.scale = p.scale, memcpy(own.each, each, sizeof each);
    CHECK_OK(roln_ae_init_pod(&chart_own_model.ae, FEW, Q, 1 / own.scale.q, own.each, own.theta, own_start.init_pod.room,
                              own_start.init_pod.work));
    CHECK(same(chart_own_ae_size, p.theta, own.theta));
    for (k = 0; k < 3; k++) {
        const roln_status st = chart_chart_refine(&p, &b, &turn, &left[0]);
        CHECK(chart_own_chart_refine(&own, &own_b, &own_turn, &left[1]) == st && (k > 0 || st == ROLN_OK));
        CHECK(same(chart_own_ae_size, p.theta, own.theta) && same(1, left, left + 1) && same(2, p.zd_max, own.zd_max));
    }
    CHECK_OK(chart_chart_add(&p, FEW, q, &sums, &start.chart_add));
    CHECK_OK(chart_own_chart_add(&own, FEW, Q, &own_sums, &own_start.chart_add));
    CHECK(memcmp(sums.sums, own_sums.sums, sizeof sums.sums) == 0 && sums.sums[0] > FEW - 1);
    CHECK_OK(chart_own_init_pod(&own, FEW, Q, Qd, bar, &s, &own_start.init_pod)); /* whatever the units, it finds them */
    for (k = 0; k < 5; k++)
        CHECK(own.each[k] > each[k] / 8 && own.each[k] < 8 * each[k]);
}

/* ---- units of a recording --------------------------------------------------------------------- */

/* each_j is the rms of a joint, 1 of one at rest and of an angle; mean |x|^2 = n. Joints that are not finite have no scale. */
static void test_fit(void)
{
    enum { N = 4, SAMPLES = 1000 };
    roln_model md = alike_model;
    static roln_real q[SAMPLES * N], qd[SAMPLES * N];
    roln_real bar[N], each[N];
    roln_scale sc = {7, 7, 7};
    ld mean = 0, square = 0, rate = 0, x2 = 0;
    uint64_t s = 4;
    int i, j;
    md.ae.size[0] = md.lnn.n = N, md.own = 1;
    dyadic(SAMPLES * N, 1, &s, q), dyadic(SAMPLES * N, 1, &s, qd);
    for (i = 0; i < SAMPLES; i++)
        q[i * N + 1] *= 1000, qd[i * N + 1] *= 1000, q[i * N + 2] = ROLN_C(3.7), qd[i * N + 2] = 0;
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK(all(1, each + 2, 1) && each[1] > 100 && each[0] < 1);
    for (j = 0; j < N; j++) {
        ld x = 0;
        for (mean = 0, i = 0; i < SAMPLES; i++)
            mean += (ld)q[i * N + j] / SAMPLES;
        for (square = 0, i = 0; i < SAMPLES; i++)
            square += ((ld)q[i * N + j] - mean) * ((ld)q[i * N + j] - mean) / SAMPLES;
        if (j != 2) CHECK_NEAR(each[j], sqrtl(square), 20 * EPS * (ld)each[j]);
        for (i = 0; i < SAMPLES; i++)
            x += ((ld)qd[i * N + j] / (ld)each[j]) * ((ld)qd[i * N + j] / (ld)each[j]) / SAMPLES;
        x2 += square / ((ld)each[j] * (ld)each[j] * (ld)sc.q * (ld)sc.q), rate += x / ((ld)sc.q * (ld)sc.q);
    }
    CHECK_NEAR(x2, N, 40 * N * EPS);
    CHECK_NEAR(rate * (ld)sc.t * (ld)sc.t, N, 40 * N * EPS);
    md.lnn.angles = 1; /* the first joint turns round */
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK(all(1, each, 1) && each[1] > 100 && all(1, &sc.q, 1));
    for (mean = 0, i = 0; i < SAMPLES; i++) /* the second is far from its mean, and no turn away */
        mean += (ld)q[i * N + 1] / SAMPLES;
    CHECK_NEAR(bar[1], mean, 1000 * PICK(100, 20) * EPS);
    for (i = 0; i < 2; i++) {
        const roln_real was = q[N + 1], bad[2] = {(roln_real)NAN, (roln_real)INFINITY};
        q[N + 1] = bad[i], sc.q = sc.t = 7;
        CHECK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each) == ROLN_E_NOT_FINITE && all(1, &sc.q, 7) && all(1, &sc.t, 7));
        CHECK(all(1, each + 1, 1));
        q[N + 1] = was;
    }
    fill(SAMPLES * N, 0, q);
    CHECK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each) == ROLN_E_NOT_FINITE && all(N, each, 1));
    for (i = 0; i < SAMPLES; i++)
        q[i * N + 3] = i % 2 ? ROLN_C(1e-3) : -ROLN_C(1e-3); /* about 0 it may be as little as it likes */
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK_NEAR(each[3], 1e-3, PICK(2e-3, 0.2) * EPS);
}

enum { LONG = 120 };

/* A slider that moves by hundredths beside a hinge that moves by one. */
static void slide(roln_real metre, roln_real *q, roln_real *qd)
{
    int i;
    for (i = 0; i < LONG; i++) {
        const double t = 0.0625 * i;
        q[2 * i] = metre * (roln_real)(0.02 * cos(1.3 * t)), qd[2 * i] = metre * (roln_real)(-0.026 * sin(1.3 * t));
        q[2 * i + 1] = (roln_real)sin(t), qd[2 * i + 1] = (roln_real)cos(t);
    }
}

/* The errors half a second ahead after forty updates, of all joints and of each. */
#define LEARN(of, metre, e, joints, p) \
    do { \
        static of##_optimiser o; \
        static of##_gradient g; \
        static of##_start init; \
        static of##_train train; \
        roln_batch b = {16, 4, 1, start, q, qd, NULL, NULL}; \
        roln_loss weights = ROLN_ODE_WEIGHTS, var = ROLN_ODE_WEIGHTS; \
        uint64_t s = 6; \
        int step; \
        memset(&o, 0, sizeof o); \
        slide(metre, q, qd); \
        CHECK_OK(of##_init_pod(p, LONG, q, qd, bar, &s, &init.init_pod)); \
        CHECK_OK(of##_variance(p, &b, &var, &train.variance)); \
        roln_loss_divide(&weights, &var); \
        for (step = 0; step < 40; step++) { \
            memset(&g, 0, sizeof g); \
            CHECK_OK(of##_grad(p, &weights, &b, ROLN_C(0.0625), &g, &train.grad)); \
            CHECK_OK(of##_update(p, &opt, &o, &g, &train.update)); \
        } \
        CHECK_OK(of##_errors(p, &b, ROLN_C(0.0625), 4, bar, &(roln_errors){e, joints, NULL}, &train.errors)); \
    } while (0)

/* Metres or millimetres: the same training, to rounding, and where a unit is 2^10 times another to the bit. With one unit for both
   joints it is another training. */
static void test_metres(void)
{
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    static roln_real q[2 * LONG], qd[2 * LONG];
    static rail_params p[3];
    static alike_params one;
    roln_error e[4][2], joints[4][4];
    roln_real bar[2];
    int start[16], i;
    for (i = 0; i < 16; i++)
        start[i] = 7 * i;
    LEARN(rail, 1, e[0], joints[0], &p[0]);
    LEARN(rail, 1024, e[1], joints[1], &p[1]);
    LEARN(rail, 1000, e[2], joints[2], &p[2]);
    CHECK(same(rail_theta_size, p[0].theta, p[1].theta) && memcmp(e[0], e[1], sizeof e[0]) == 0);
    CHECK(p[1].each[0] == 1024 * p[0].each[0] && p[1].each[1] == p[0].each[1] && p[0].each[0] < ROLN_C(0.02));
    CHECK(joints[1][2].q == 1048576 * joints[0][2].q && joints[1][3].q == joints[0][3].q);
    BOUND("own units: metres, millimetres", fabsl((ld)e[2][1].q / (ld)e[0][1].q - 1), PICK(1e-3, 1e-9));
    CHECK_BELOW((ld)joints[0][2].q / (ld)joints[0][2].q_var, 0.05);
    LEARN(alike, 1, e[2], joints[2], &one);
    LEARN(alike, 1024, e[3], joints[3], &one);
    CHECK_BELOW(0.1, fabsl((ld)(e[3][1].q / e[3][1].q_var) / (ld)(e[2][1].q / e[2][1].q_var) - 1));
}

void TEST_NAME(units_training)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_losses(k);
        test_errors(k);
#ifdef ROLN_DOUBLE
        test_slope(k, ODE), test_slope(k, ACC), test_slope(k, POSITIONS);
#endif
    }
    test_charts();
    test_fit();
    test_metres();
    print_bounds();
}
