/* SPDX-License-Identifier: MIT */
/* test_sums.c - what never ends: sums over ten million samples against the exact answer, counts, angles on any turn. Motion has a
   period of PERIOD samples, so that the exact answer is that of one period. `sample`: a million. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

#define ROLN_NAME one
#define ROLN_AE 1
#define ROLN_MLP 1
#define ROLN_BLOCK 16
#define ROLN_HORIZON 1
#include "roln.h"

#define ROLN_NAME turn
#define ROLN_AE 1
#define ROLN_MLP 2
#define ROLN_ANGLES 1
#define ROLN_HORIZON 4
#include "roln.h"

#define ROLN_NAME mid
#define ROLN_AE 1
#define ROLN_MLP 2
#define ROLN_ANGLES 1
#define ROLN_INTEGRATOR midpoint
#include "roln.h"

#define ROLN_NAME bow /* a chart */
#define ROLN_AE 2, 1
#define ROLN_MLP 2
#define ROLN_CHART polynomial, 2
#include "roln.h"

#include "twin.h"

#define CHECK_OK(expr) CHECK((expr) == ROLN_OK)

static const roln_real dt = ROLN_C(0.0625);

enum { PERIOD = 1000 };

static int samples(void)
{
    return check_sample ? 1000000 : 10000000;
}

/* 1 + 0.01 sin, and a velocity of the same size, repeated. */
static roln_real *stream(int count, int N, double from, double size)
{
    roln_real *x = malloc((size_t)count * (size_t)N * sizeof *x);
    int k;
    if (!x) exit(2);
    for (k = 0; k < count * N; k++)
        x[k] = (roln_real)(from + size * sin(6.283185307179586 * (k / N % PERIOD) / PERIOD + k % N));
    return x;
}

/* Mean of one period of x [.][N], column i, and the mean square about it. */
static ld mean_of(const roln_real *x, int N, int i)
{
    ld sum = 0;
    int k;
    for (k = 0; k < PERIOD; k++)
        sum += (ld)x[k * N + i] / PERIOD;
    return sum;
}

static ld square_of(const roln_real *x, int N, int i, ld mid)
{
    ld sum = 0;
    int k;
    for (k = 0; k < PERIOD; k++)
        sum += ((ld)x[k * N + i] - mid) * ((ld)x[k * N + i] - mid) / PERIOD;
    return sum;
}

static void test_scale(const roln_real *q, const roln_real *qd, int count)
{
    const ld mean = mean_of(q, 1, 0), square = square_of(q, 1, 0, mean), fast = square_of(qd, 1, 0, 0);
    static one_params p;
    static one_start start;
    static one_train train;
    const roln_batch b = {.count = count, .stride = 1, .q = q, .qd = qd, .qdd = qd, .tau = q};
    roln_real qbar[1];
    roln_loss var = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    uint64_t seed = 1;
    CHECK_OK(one_init_pod(&p, count, q, qd, qbar, &seed, &start.init_pod));
    CHECK_NEAR(qbar[0], mean, 2 * EPS * mean);
    CHECK_NEAR(p.scale.q, sqrtl(square), PICK(1e-5, 1e-11) * sqrtl(square));
    CHECK_NEAR(p.scale.t, sqrtl(square / fast), PICK(1e-5, 1e-11) * sqrtl(square / fast));
    CHECK_OK(one_variance(&p, &b, &var, &train.variance)); /* of q / scale.q, about 100 */
    BOUND("sums: variance of q (eps)", fabsl((ld)var.q / (square / ((ld)p.scale.q * (ld)p.scale.q)) - 1) / EPS, PICK(500, 1e5));
    BOUND("sums: variance of qd (eps)", fabsl((ld)var.qd / 1 - 1) / EPS, PICK(500, 1e5)); /* double is plain */
    CHECK_OK(one_fit_inertia(&p, &b, &train.fit_inertia));
}

static void test_error_sums(const roln_real *q, const roln_real *qd, int count)
{
    static one_params p;
    static one_start start;
    static one_train train;
    const ld mean = mean_of(q, 1, 0);
    const roln_real qbar[1] = {(roln_real)mean};
    const roln_batch all = {.count = count, .stride = 1, .q = q, .qd = qd};
    const roln_batch period = {.count = PERIOD, .stride = 1, .q = q, .qd = qd};
    roln_error e[1], joint[1], once[1];
    uint64_t seed = 1;
    const double times = count / PERIOD;
    CHECK_OK(one_init(&p, &seed, &start.init));
    CHECK_OK(one_errors(&p, &all, dt, 1, qbar, &(roln_errors){e, joint, NULL}, &train.errors));
    CHECK_OK(one_errors(&p, &period, dt, 1, qbar, &(roln_errors){once, NULL, NULL}, &train.errors));
    CHECK_NEAR(e[0].q_var / times, once[0].q_var, 1e-9 * once[0].q_var);
    CHECK_NEAR(e[0].qd_var / times, once[0].qd_var, 1e-9 * once[0].qd_var);
    CHECK_NEAR(joint[0].q_var / times, once[0].q_var, 1e-9 * once[0].q_var);
    CHECK_NEAR(e[0].q_var / count, square_of(q, 1, 0, (ld)qbar[0]), 1e-5 * (double)square_of(q, 1, 0, mean));
}

/* A gradient over an eighth of `count` windows, in calls of many: that of one period as often as it comes. */
static void test_gradients(const roln_real *q, const roln_real *qd, int count)
{
    enum { EACH = 100 * PERIOD };
    static const roln_loss weights[2] = {ROLN_ODE_WEIGHTS, ROLN_ACC_WEIGHTS};
    static one_params p;
    static one_start start;
    static one_train train;
    static one_gradient all_of, once;
    uint64_t seed = 3;
    int kind, k, i;
    CHECK_OK(one_init(&p, &seed, &start.init));
    for (kind = 0; kind < 2; kind++) {
        const roln_batch many = {.count = EACH, .steps = !kind, .stride = 1, .q = q, .qd = qd, .qdd = qd};
        roln_batch few = many;
        ld off = 0, top = 0;
        const roln_real none[1] = {(roln_real)NAN};
        memset(&all_of, 0, sizeof all_of), memset(&once, 0, sizeof once);
        few.count = PERIOD;
        for (k = 0; k < count / EACH / 8; k++)
            CHECK_OK(kind ? one_grad_acc(&p, &weights[1], &many, &all_of, &train.grad_acc)
                          : one_grad(&p, &weights[0], &many, dt, &all_of, &train.grad));
        CHECK_OK(kind ? one_grad_acc(&p, &weights[1], &few, &once, &train.grad_acc)
                      : one_grad(&p, &weights[0], &few, dt, &once, &train.grad));
        for (i = 0; i < one_theta_size; i++)
            top = fmaxl(top, fabsl((ld)once.theta[i]) * k * EACH / PERIOD);
        for (i = 0; i < one_theta_size; i++)
            off = fmaxl(off, fabsl((ld)all_of.theta[i] - (ld)once.theta[i] * k * EACH / PERIOD));
        CHECK(all_of.windows == (roln_real)k * EACH);
        few.q = none, few.count = 1, few.steps = 0; /* a block that fails */
        CHECK((kind ? one_grad_acc(&p, &weights[1], &few, &all_of, &train.grad_acc)
                    : one_grad(&p, &weights[0], &few, dt, &all_of, &train.grad)) == ROLN_E_NOT_FINITE);
        CHECK(all_of.windows == (roln_real)k * EACH);
        BOUND("sums: gradient (eps of the largest)", top > 0 ? off / top / EPS : 0, 200);
        BOUND("sums: loss (eps)", fabsl((ld)roln_loss_total(&weights[kind], &all_of.loss) * PERIOD / EACH / k /
                                  (ld)roln_loss_total(&weights[kind], &once.loss) - 1) / EPS, 200);
    }
    /* windows count on beyond the last integer of a float */
    memset(&all_of, 0, sizeof all_of);
    all_of.windows = ROLN_C(16777216.0);
    for (k = 0; k < 4; k++) {
        const roln_batch b = {.count = 1, .stride = 1, .q = q, .qd = qd};
        CHECK_OK(one_grad(&p, &weights[0], &b, dt, &all_of, &train.grad));
    }
    CHECK(all_of.windows == ROLN_C(16777220.0));
}

/* Turns of an angle: its mean, and that of one that is far out. */
static void test_means_of_angles(int count)
{
    roln_real *q = stream(count, 1, 1, 0.3), *qd = stream(count, 1, 0, 1), qbar[1];
    roln_scale sc;
    CHECK_OK(roln_fit_scale(&turn_model, count, q, qd, qbar, &sc, NULL));
    CHECK_NEAR(qbar[0], mean_of(q, 1, 0), 2 * EPS);
    free(q), free(qd);
}

/* Sums of a chart and of its start, the noise of a joint, a torque over many samples. */
static void test_other_sums(int count)
{
    roln_real *q = stream(count, 2, 1, 0.01), *qd = stream(count, 2, 0, 0.01), qbar[2], left, each[2], few[2], x[1];
    static bow_params p, of_period;
    static bow_start start;
    static bow_chart sums;
    uint64_t seed = 1;
    const roln_batch all = {1, count - 1, 1, NULL, q, NULL, NULL, NULL};
    const roln_batch period = {1, 100 * PERIOD - 1, 1, NULL, q, NULL, NULL, NULL};
    const roln_batch held = {1, 1, count - 1, NULL, q, NULL, NULL, q};
    int i;
    CHECK_OK(bow_init_pod(&p, count, q, qd, qbar, &seed, &start.init_pod));
    CHECK_OK(bow_init_pod(&of_period, PERIOD, q, qd, qbar, &seed, &start.init_pod));
    for (i = 0; i < 6; i++) /* Phi, Psi, b */
        CHECK_NEAR(p.theta[i], of_period.theta[i], PICK(1e-4, 1e-9) * (1 + fabs((double)of_period.theta[i])));
    CHECK_OK(bow_chart_add(&p, count, q, &sums, &start.chart_add));
    CHECK_OK(bow_chart_solve(&p, &sums, ROLN_CHART_RIDGE, &left, &start.chart_solve));
    CHECK(sums.sums[0] == count);
    rolni_noise_of_joints(&bow_model, &all, each), rolni_noise_of_joints(&bow_model, &period, few);
    for (i = 0; i < 2; i++)
        CHECK_NEAR(each[i], few[i], 1e-3 * (double)few[i]);
    rolni_gather_tau(&held, 1, 0, 1, 0, 1, x);
    CHECK_NEAR(x[0], 1, 1e-2);
    CHECK_NEAR(x[0], (mean_of(q, 2, 0) + mean_of(q, 2, 1)) / 2, 1e-6);
    free(q), free(qd);
}

/* A step for an encoder is the same from a thousand samples and from these many times over. */
static void test_encoder_steps(int count)
{
    static bow_params p[2];
    static bow_start start;
    static bow_refinement step[2];
    const int counts[2] = {PERIOD, count / PERIOD * PERIOD};
    roln_real *q = stream(counts[1], 2, 0, 1), *qd = stream(counts[1], 2, 0, 1), qbar[2], left[2] = {0, 0};
    int i, k;
    for (i = 0; i < counts[1]; i++) /* near a bow, and its velocities */
        q[2 * i + 1] = q[2 * i] / 2 + q[2 * i] * q[2 * i] / 4 + q[2 * i + 1] / 64, qd[2 * i + 1] = qd[2 * i] / 2;
    for (i = 0; i < 2; i++) {
        uint64_t seed = 1;
        roln_batch b = {0, 0, 1, NULL, NULL, NULL, NULL, NULL};
        b.count = counts[i], b.q = q, b.qd = qd;
        CHECK_OK(bow_init_pod(&p[i], PERIOD, q, qd, qbar, &seed, &start.init_pod));
        for (k = 0; k < 3; k++)
            CHECK_OK(bow_chart_refine(&p[i], &b, &step[i], &left[i]));
    }
    CHECK_NEAR(left[1], left[0], PICK(1e-6, 1e-10) * (double)left[0]);
    for (i = 0; i < bow_ae_size; i++)
        CHECK_NEAR(p[1].theta[i], p[0].theta[i], PICK(8e-6, 1e-9) * (1 + fabs((double)p[0].theta[i])));
    free(q), free(qd);
}

/* ---- turns ------------------------------------------------------------------------------------ */

/* A step is the same on every turn, as far as the angle can be written there: 1000 steps, which go 1.4 rad or so. */
static void test_turns(void)
{
    static const double turns[] = {0, 1, 2, 3, 100, 20000, 160000, -1, -100, -160000};
    static turn_params p;
    static turn_start start;
    static turn_work work;
    static turn_linear_work linear;
    static mid_params pm;
    static mid_start starts;
    static mid_work works;
    uint64_t seed = 5;
    ld path[3] = {0, 0, 0};
    int c, k, which;
    CHECK_OK(turn_init(&p, &seed, &start.init)), CHECK_OK(mid_init(&pm, &seed, &starts.init));
    for (c = 0; c < 10; c++)
        for (which = 0; which < 3; which++) {
            const double from = 1 + 6.283185307179586 * turns[c];
            turn_latent s = {{(roln_real)from}, {3}};
            mid_latent sm = {{(roln_real)from}, {3}};
            turn_jacobian ab;
            ld went = 0;
            for (k = 0; k < 1000; k++) {
                const roln_real before = which == 2 ? sm.z[0] : s.z[0];
                if (which == 0) CHECK_OK(turn_step(&p, &s, NULL, ROLN_C(0.001), &work.step));
                if (which == 1) CHECK_OK(turn_linear(&p, &s, NULL, ROLN_C(0.001), &ab, &linear));
                if (which == 2) CHECK_OK(mid_step(&pm, &sm, NULL, ROLN_C(0.001), &works.step));
                went += (ld)roln_wrap((which == 2 ? sm.z[0] : s.z[0]) - before);
                if (k == 0) went = 0; /* the first may turn back, by what the rounding of the start leaves */
                CHECK(fabs((double)(which == 2 ? sm.z[0] : s.z[0])) <= 13);
            }
            if (c == 0) path[which] = went;
            BOUND("turns: the way of 1000 steps, rounding of the start",
                  fabsl(went - path[which]) / (1e-3L + 2 * EPS * fabsl((ld)from)), 3);
        }
    {
        turn_latent s = {{ROLN_C(1e7)}, {3}}, was = s;
        CHECK(turn_step(&p, &s, NULL, ROLN_C(0.001), &work.step) == ROLN_E_NOT_FINITE);
        CHECK(same(1, s.z, was.z) && same(1, s.zd, was.zd));
    }
}

/* Errors and gradients of windows are those of the turn next to 0. */
static void test_windows_turned(void)
{
    enum { STEPS = 3, FAR = 20000 };
    static turn_params p;
    static turn_start start;
    static turn_train train;
    static turn_gradient g[2];
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    roln_real q[2][STEPS + 1], qd[STEPS + 1], qbar[1] = {1};
    roln_error e[2][STEPS + 1];
    uint64_t seed = 6;
    int k, i;
    CHECK_OK(turn_init(&p, &seed, &start.init));
    for (k = 0; k <= STEPS; k++)
        q[1][k] = (roln_real)(6.283185307179586 * FAR + 1 + 0.002 * k), qd[k] = 2, q[0][k] = roln_wrap(q[1][k]);
    for (i = 0; i < 2; i++) {
        const roln_batch b = {.count = 1, .steps = STEPS, .stride = 1, .q = q[i], .qd = qd};
        memset(&g[i], 0, sizeof g[i]);
        CHECK_OK(turn_grad(&p, &weights, &b, ROLN_C(0.001), &g[i], &train.grad));
        CHECK_OK(turn_errors(&p, &b, ROLN_C(0.001), 1, qbar, &(roln_errors){e[i], NULL, NULL}, &train.errors));
    }
    CHECK(same(turn_theta_size, g[0].theta, g[1].theta) && memcmp(e[0], e[1], sizeof e[0]) == 0);
}

/* A wheel that turns freely at 100 rad/s: errors of a roll-out of 20 s are those of a step, as far as floats go. And a first sample
   on a far turn takes nothing from the digits of others: mean and variance. */
static void test_far_first(void)
{
    enum { STEPS = 20000, FEW = 1000 };
    static turn_params p;
    static turn_start start;
    static turn_train train;
    static roln_real q[STEPS + 1], qd[STEPS + 1];
    static roln_error e[5];
    const roln_real qbar[1] = {0};
    const roln_batch b = {.count = 1, .steps = STEPS, .stride = 1, .q = q, .qd = qd};
    const roln_batch all = {.count = FEW, .stride = 1, .q = q, .qd = qd};
    uint64_t seed = 6;
    roln_real mean[1];
    roln_loss var = {0};
    int k, turns;
    CHECK_OK(turn_init(&p, &seed, &start.init));
    memset(p.theta, 0, sizeof p.theta);
    for (k = 0; k <= STEPS; k++)
        q[k] = (roln_real)remainder(0.1 * k, 6.283185307179586), qd[k] = 100;
    CHECK_OK(turn_errors(&p, &b, ROLN_C(0.001), STEPS / 4, qbar, &(roln_errors){e, NULL, NULL}, &train.errors));
    for (k = 0; k < 5; k++)
        BOUND("a wheel for 20 s, rad", sqrtl((ld)e[k].q), PICK(0.02L, 1e-10L));
    for (turns = 0; turns <= 10000; turns += 2500) {
        for (k = 0; k < FEW; k++)
            q[k] = (roln_real)(0.02 * sin(k * 6.283185307179586 / 50)), qd[k] = 1 + q[k];
        q[0] = (roln_real)(turns * 6.283185307179586);
        CHECK_OK(turn_variance(&p, &all, &var, &train.variance));
        CHECK_NEAR(var.q, 0.0002, 2e-6);
        CHECK_OK(turn_init_pod(&p, FEW, q, qd, mean, &seed, &start.init_pod));
        CHECK_NEAR(mean[0], 0, 1e-4);
        memset(p.theta, 0, sizeof p.theta);
    }
}

/* Counts that never end stay at their largest number. */
static void test_counts(void)
{
    CHECK(rolni_counted(0, 5) == 5 && rolni_counted(UINT32_MAX - 2, 2) == UINT32_MAX);
    CHECK(rolni_counted(UINT32_MAX - 2, 3) == UINT32_MAX);
}

void TEST_NAME(sums)(void);
void TEST_NAME(sums)(void)
{
    const int count = samples();
    roln_real *q = stream(count, 1, 1, 0.01), *qd = stream(count, 1, 0, 0.02);
    test_scale(q, qd, count);
    test_error_sums(q, qd, count);
    test_gradients(q, qd, count);
    free(q), free(qd);
    test_means_of_angles(count);
    test_other_sums(count);
    test_encoder_steps(count);
    test_turns();
    test_windows_turned();
    test_far_first();
    test_counts();
}
