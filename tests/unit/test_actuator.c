/* SPDX-License-Identifier: MIT */
/* Learned actuators (ROLN_ACTUATOR): the force of currents and servos from its definition, in a step and reduced; every derivative
   against differences, also by gains, offsets and dampings, through every integrator; the inputs that NAME_lift and NAME_allocate
   send; joints in units of their own; the power that the guard counts; a servo'd joint against its motion in closed form; gains
   that are learned from recordings; parameters of other actuators are refused. */

#include "check.h"

/* One joint under a drive: with weights of 0, M = 1 and V = 0. */
#define ROLN_NAME joint
#define ROLN_AE 1
#define ROLN_MLP 2
#define ROLN_ACTUATOR servo
#include "roln.h"

/* Two links under currents, and under drives. */
#define ROLN_NAME arm
#define ROLN_AE 2
#define ROLN_MLP 16
#define ROLN_ANGLES 1, 1
#define ROLN_ACTUATOR current
#include "roln.h"

#define ROLN_NAME drives
#define ROLN_AE 2
#define ROLN_MLP 16
#define ROLN_ANGLES 1, 1
#define ROLN_ACTUATOR servo
#include "roln.h"

#define OF_ACTUATORS
#ifdef ROLN_DOUBLE
#define CALLED(X) X(step) X(linear) X(grad)
#define SMALL(name) name##_midpoint
#define SMALL_STEP(scheme) midpoint
#define SMALL_SCALE each
#include "small_models.h"
#define SMALL(name) name##_rk4
#define SMALL_STEP(scheme) rk4
#define SMALL_SCALE each
#include "small_models.h"
#define SMALL(name) name##_euler
#define SMALL_STEP(scheme) euler
#include "small_models.h"
#endif
#undef CALLED
/* The models below with joints in units of their own. */
#define CALLED(X) X(reduce) X(lift) X(allocate) X(step) X(linear)
#define SMALL(name) name##_own
#define SMALL_SCALE each
#include "small_models.h"
#undef CALLED
#define CALLED(X) \
    X(encode) X(decode) X(step) X(linear) X(dynamics) X(reduce) X(lift) X(allocate) X(grad) X(grad_acc) X(rows) X(fit_inertia) \
    X(force_variance) X(push) X(slopes)
#define SMALL_ROWS 3
#define SMALL_LEARN everything
#include "small.h"
#include "samples.h"
#include "differences.h"
#include "units.h"

void TEST_NAME(actuator)(void);

#ifdef ROLN_DOUBLE
#define MIDPOINT_CALLED(name) name##_midpoint_called
#define RK4_CALLED(name) name##_rk4_called
#define EULER_CALLED(name) name##_euler_called
static const model *const others[3][MODELS] = {SMALL_TABLE(MIDPOINT_CALLED, MIDPOINT_CALLED), SMALL_TABLE(RK4_CALLED, RK4_CALLED),
                                               SMALL_TABLE(EULER_CALLED, EULER_CALLED)};
#endif

/* The torque of joint j in user's units, from the numbers in theta: log k, o, log d of all joints. */
static ld torque(int k, const instance *m, int j, ld u, ld q, ld qd)
{
    const int N = N_OF(k), kind = models[k]->md->actuator;
    const roln_real *a = m->theta + models[k]->params - N * (kind + 1) + j;
    const ld q1 = (ld)m->scale->q, t = (ld)m->scale->t, gain = expl((ld)a[0]), offset = (ld)a[N] * (ld)m->scale->m / (q1 * t * t);
    if (kind == ROLN_CURRENT) return gain * u + offset;
    return gain * difference(k, j, u, q) - expl((ld)a[2 * N]) * t * qd + offset;
}

/* tau_z = J^T tau, column by column of J. */
static void force_of(int k, const instance *m, const roln_real *z, const roln_real *zd, const roln_real *u, ld *tau_z)
{
    const int N = N_OF(k), n = n_OF(k);
    roln_real q[MAXN], qd[MAXN], again[MAXN], column[MAXN], e[MAXN];
    int i, j;
    CHECK_OK(m->of->decode(m, z, zd, q, qd, ROOM(decode)));
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) e[j] = i == j;
        CHECK_OK(m->of->decode(m, z, e, again, column, ROOM(decode)));
        for (tau_z[i] = 0, j = 0; j < N; j++) tau_z[i] += (ld)column[j] * torque(k, m, j, (ld)u[j], (ld)q[j], (ld)qd[j]);
    }
}

/* The reduced force, and back: the input that lift sends makes the force that was wanted. */
static void test_lift(int k, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real s[2 * MAXN] = {0}, u[MAXN], tau_z[MAXN], back[MAXN], bad[MAXN];
    ld wide[MAXN];
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta_k, seed, spare)); /* D J = I */
    dyadic(n, 1, seed, s), dyadic(N, ROLN_C(0.25), seed, u); /* an angle turns by less than pi; at rest, as called.h asks */
    CHECK_OK(m.of->reduce(&m, s, u, tau_z, ROOM(reduce)));
    ROOM_KEPT();
    force_of(k, &m, s, s + n, u, wide);
    BOUND("tau_z, eps", distance(n, tau_z, wide) / EPS, 20);
    CHECK_OK(m.of->lift(&m, s, tau_z, u, ROOM(lift)));
    ROOM_KEPT();
    CHECK_OK(m.of->reduce(&m, s, u, back, ROOM(reduce)));
    widen(n, tau_z, wide);
    BOUND("reduce(lift), eps", distance(n, back, wide) / EPS, 40);
    tau_z[0] = rolni_real(ROLNI_INF);
    fill(MAXN, 7, bad);
    CHECK(m.of->lift(&m, s, tau_z, bad, ROOM(lift)) == ROLN_E_NOT_FINITE && all(MAXN, bad, 7));
}

/* Currents of a few motors at the joints; servos belong to joints. */
static void test_motors(int k, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real B[4 * MAXN], s[2 * MAXN] = {0}, u[4], v[MAXN], tau_z[MAXN], back[MAXN], missed = 7;
    roln_motors motors = {3, NULL, 0};
    ld wide[MAXN];
    roln_status st;
    int i, j;
    dyadic(3 * N, 1, seed, B), dyadic(n, 1, seed, s), dyadic(n, 1, seed, tau_z);
    motors.B = B;
    st = m.of->allocate(&m, s, &motors, tau_z, u, &missed, ROOM(allocate));
    if (models[k]->md->actuator == ROLN_SERVO) {
        CHECK(st == ROLN_E_LENGTH && all(1, &missed, 7) && !rolni_motors_valid(models[k]->md, &motors));
        return;
    }
    CHECK(st == ROLN_OK && all(1, &missed, 0) && rolni_motors_valid(models[k]->md, &motors));
    for (i = 0; i < N; i++)
        for (v[i] = 0, j = 0; j < 3; j++) v[i] += B[3 * i + j] * u[j];
    CHECK_OK(m.of->reduce(&m, s, v, back, ROOM(reduce)));
    widen(n, tau_z, wide);
    BOUND("force of motors, eps", distance(n, back, wide) / EPS, 100);
}

/* No input is an input of 0; and the unit of inertia is that of the gains as they are. */
static void test_inputs(int k, uint64_t *seed)
{
    static data d;
    static gradient g[2];
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int N = N_OF(k);
    roln_real *const a = theta_k + models[k]->params - N * (models[k]->md->actuator + 1);
    roln_real inertia[2] = {1, 1}, variance[MAXN];
    int kind, i;
    for (kind = ODE; kind <= ACC; kind += ACC - ODE) {
        make(k, kind, 3, seed, &d);
        d.b.tau = NULL;
        CHECK_OK(grad_of(&m, &d, &g[0]));
        memset(d.tau, 0, sizeof d.tau), d.b.tau = d.tau;
        CHECK_OK(grad_of(&m, &d, &g[1]));
        CHECK(same(models[k]->params, g[0].theta, g[1].theta));
    }
    make(k, ACC, 4, seed, &d), fill(MAXN, 7, variance);
    CHECK(m.of->force_variance(&m, &d.b, variance, ROOM(force_variance)) == ROLN_E_SHAPE && all(MAXN, variance, 7));
    for (i = 0; i < 2 * N; i++) a[i] = 0; /* gains of 1, no offsets */
    CHECK_OK(m.of->fit_inertia(&m, &d.b, inertia, ROOM(fit_inertia)));
    for (i = 0; i < N; i++) a[i] = ROLN_C(1.3862943611198906); /* of 4 */
    CHECK_OK(m.of->fit_inertia(&m, &d.b, inertia + 1, ROOM(fit_inertia)));
    if (models[k]->md->actuator == ROLN_CURRENT) CHECK_NEAR((double)(inertia[1] / inertia[0]), 4, 1e-5);
    CHECK(inertia[1] > inertia[0]);
}

/* Inputs x [N] of the model with joints in common units for the one with own units: currents over each, positions times each. */
static void inputs_in_units(const pair *p, const roln_real *x, roln_real *y)
{
    in_units(p, models[p->k]->md->actuator == ROLN_SERVO ? 1 : -1, 1, x, y);
}

/* Two arrays [count] that differ by the rounding of gains. */
static void check_close(int count, const roln_real *x, const roln_real *y)
{
    ld wide[512];
    widen(count, x, wide);
    BOUND("own units of servos, eps", distance(count, y, wide) / EPS, 20);
}

/* Joints in units that are powers of two, with gains in these units: the bits of joints that were scaled by hand. Those of servos
   differ by the rounding of log k and log d. */
static void test_own_units(int k, uint64_t *seed)
{
    static pair p;
    static twice x;
    static roln_real theta[MAXP];
    roln_real s[2 * MAXN], u[2][MAXN], by[MAXN];
    const int servo = models[k]->md->actuator == ROLN_SERVO;
    int i, n, N;
    pair_of(k, seed, &p), n = p.n, N = p.N;
    dyadic(2 * n, ROLN_C(0.5), seed, s), dyadic(N, ROLN_C(0.25), seed, u[0]), inputs_in_units(&p, u[0], u[1]);
    memcpy(theta, p.theta, sizeof theta), p.own.theta = theta;
    for (i = 0; i < N && servo; i++) { /* k and d over each^2 */
        roln_real *const a = theta + models[k]->params - 3 * N + i;
        const roln_real less = (roln_real)(2 * logl((ld)p.each[i]));
        a[0] -= less, a[2 * N] -= less;
    }
    make_twice(&p, s, u, &x);
    fill(MAXN, 1, by), inputs_in_units(&p, by, by), inputs_in_units(&p, x.lifted[0], x.lifted[0]);
    for (i = 0; i < 2 * n * N; i++) x.B[1][i] *= by[i % N]; /* by inputs of the first */
    if (servo) {
        for (i = 0; i < N; i++) x.lifted[0][i] /= p.each[i], x.lifted[1][i] /= p.each[i];
        check_close(n, x.tau_z[0], x.tau_z[1]), check_close(N, x.lifted[0], x.lifted[1]);
        check_close(2 * n, x.s[0], x.s[1]);
        check_close(4 * n * n, x.A[0], x.A[1]), check_close(2 * n * N, x.B[0], x.B[1]);
        return;
    }
    CHECK(same(n, x.tau_z[0], x.tau_z[1]) && same(N, x.lifted[0], x.lifted[1]) && same(2 * n, x.s[0], x.s[1]));
    CHECK(same(4 * n * n, x.A[0], x.A[1]) && same(2 * n * N, x.B[0], x.B[1]));
    for (i = 0; i < 2; i++) { /* two motors of the same machine: their rows over each */
        const instance *m = i ? &p.own : &p.plain;
        roln_real rows[2 * MAXN];
        const roln_motors motors = {2, rows, ROLN_C(0.5)};
        int j;
        for (j = 0; j < 2 * N; j++) rows[j] = (roln_real)(j % 3 + 1) / (i ? p.each[j / 2] : 1);
        CHECK_OK(m->of->allocate(m, s, &motors, s + n, x.lifted[i], NULL, room_of(m->of->scratch.allocate)));
        ROOM_KEPT();
    }
    CHECK(same(2, x.lifted[0], x.lifted[1]) && largest(2, x.lifted[0]) > 0);
}

/* z'' = k (u - z) - d z' + o from rest: steps against the damped oscillation in closed form, and the guard's balance of it. */
static void test_oscillation(void)
{
    static joint_params p;
    static joint_step_work w;
    static joint_guard_tick_work gw;
    joint_latent s = {{0}, {0}};
    joint_guard g;
    joint_state x;
    roln_limits l;
    const ld k = 9, d = 1.2L, o = 0.5L, u = 0.75L, end = u + o / k, decay = d / 2, turn = sqrtl(k - decay * decay);
    roln_real gain[1], damping[1], offset[1];
    const roln_real send[1] = {ROLN_C(0.75)};
    int i;
    p.slope = joint_model.ae.slope, p.eigenvalue_floor = joint_model.lnn.eigenvalue_floor;
    p.scale.q = ROLN_C(0.5), p.scale.t = ROLN_C(0.25), p.scale.m = ROLN_C(0.25); /* the inertia of q: m / q^2 = 1 */
    p.z_min[0] = -4, p.z_max[0] = 4, p.zd_max[0] = 20;
    p.theta[joint_theta_size - 3] = (roln_real)logl(k);
    p.theta[joint_theta_size - 2] = (roln_real)(o * 0.5L * 0.0625L / 0.25L);
    p.theta[joint_theta_size - 1] = (roln_real)logl(d / 0.25L);
    CHECK_OK(joint_actuator_of(&p, gain, damping, offset));
    CHECK_NEAR((double)gain[0], (double)k, 1e-5), CHECK_NEAR((double)offset[0], (double)o, 1e-6);
    CHECK_NEAR((double)damping[0], (double)d, 1e-6);
    memset(&l, 0, sizeof l), memset(&g, 0, sizeof g);
    l.dt = ROLN_C(0.01), l.tau = 2, l.residual = ROLN_C(0.02), g.tau[0] = send[0];
    for (i = 1; i <= 200; i++) {
        const ld t = 0.01L * i, e = expl(-decay * t), q = end * (1 - e * (cosl(turn * t) + decay / turn * sinl(turn * t)));
        CHECK_OK(joint_step(&p, &s, send, l.dt, &w));
        CHECK_NEAR((double)s.z[0] * 0.5, (double)q, PICK(2e-5, 1e-7));
        x.q[0] = s.z[0] / 2, x.qd[0] = s.zd[0] / 2;
        CHECK(joint_guard_tick(&p, &l, &x, &s, send, &g, &gw) == 0); /* the joint gains the power of the drive */
    }
    s.zd[0] += 1, x.qd[0] = s.zd[0] / 2; /* a motion that this drive does not make */
    CHECK((joint_guard_tick(&p, &l, &x, &s, send, &g, &gw) & ROLN_FAULT_ENERGY) != 0);
    for (i = 1; i <= 3; i++) { /* damping, offset, gain */
        const roln_real was = p.theta[joint_theta_size - i];
        p.theta[joint_theta_size - i] = rolni_real(ROLNI_INF);
        CHECK(joint_actuator_of(&p, gain, damping, offset) == ROLN_E_NOT_FINITE);
        p.theta[joint_theta_size - i] = was;
    }
    p.slope = 7;
    CHECK(joint_actuator_of(&p, gain, damping, offset) == ROLN_E_SHAPE);
    CHECK_NEAR((double)damping[0], (double)d, 1e-6); /* untouched */
    CHECK_NEAR((double)gain[0], (double)k, 1e-5), CHECK_NEAR((double)offset[0], (double)o, 1e-6);
}

/* The power of currents at the joints, qd^T (k u + o), and of motors that act on both joints: the guard sees the same machine. It
   sees a motion that these currents do not make. */
static void test_power(void)
{
    static arm_params p;
    static arm_init_work w;
    static arm_step_work sw;
    static arm_guard_tick_work gw;
    static const roln_real B[4] = {1, ROLN_C(-0.5), 2, ROLN_C(0.25)}, u[2] = {ROLN_C(0.5), ROLN_C(-0.75)};
    const roln_real at_joints[2] = {B[0] * u[0] + B[1] * u[1], B[2] * u[0] + B[3] * u[1]};
    const roln_motors motors = {2, B, 0};
    arm_latent s = {{ROLN_C(0.25), ROLN_C(-0.5)}, {ROLN_C(0.5), ROLN_C(0.25)}};
    arm_guard g[2];
    arm_state x;
    roln_limits l[2];
    roln_real gain[2], offset[2];
    uint64_t seed = 7;
    int i, j;
    CHECK_OK(arm_init(&p, &seed, &w));
    for (j = 0; j < 4; j++) p.theta[arm_theta_size - 4 + j] = ROLN_C(0.25) * (roln_real)(2 * j - 3);
    CHECK_OK(arm_actuator_of(&p, gain, NULL, offset));
    fill(2, -4, p.z_min), fill(2, 4, p.z_max), fill(2, 50, p.zd_max);
    memset(l, 0, sizeof l), memset(g, 0, sizeof g);
    l[0].dt = ROLN_C(0.01), l[0].tau = 5, l[0].residual = ROLN_C(0.02), l[0].hold = 1;
    l[1] = l[0], l[1].motors = &motors;
    for (i = 0; i <= 50; i++) {
        ld power = 0;
        if (i == 50) s.zd[0] += 1;
        for (j = 0; j < 2; j++) {
            x.q[j] = s.z[j], x.qd[j] = s.zd[j];
            power += (ld)s.zd[j] * ((ld)gain[j] * (ld)at_joints[j] + (ld)offset[j]);
        }
        for (j = 0; j < 2; j++) {
            CHECK(arm_guard_tick(&p, l + j, &x, &s, j ? u : at_joints, g + j, &gw) == (i == 50 ? ROLN_FAULT_ENERGY : 0u));
            if (i < 50) CHECK_NEAR((double)g[j].g.power, (double)power, PICK(1e-5, 1e-12));
        }
        CHECK_OK(arm_step(&p, &s, at_joints, l[0].dt, &sw));
    }
}

/* A servo is sent a position beside that of its joint. Where the velocity is not known, nothing is sent. */
static void test_lift_failing(void)
{
    static drives_params p;
    static drives_init_work w;
    static drives_lift_work lw;
    const roln_real tau_z[2] = {1, -1};
    const drives_latent rest = {{ROLN_C(0.25), ROLN_C(-0.5)}, {0, 0}};
    drives_latent s = rest;
    roln_real tau[2] = {7, 7};
    uint64_t seed = 8;
    CHECK_OK(drives_init(&p, &seed, &w));
    s.zd[1] = (roln_real)NAN;
    CHECK(drives_lift(&p, &s, tau_z, tau, &lw) == ROLN_E_NOT_FINITE && all(2, tau, 7));
    CHECK_OK(drives_lift(&p, &rest, tau_z, tau, &lw));
    CHECK_NEAR((double)tau[0], 1.25, 1e-6), CHECK_NEAR((double)tau[1], -1.5, 1e-6); /* q + tau_z, of gains of 1 */
}

/* Bytes and text name the actuators; those of others are refused. */
static void test_kept(void)
{
    static arm_params p, q;
    static arm_init_work w;
    static unsigned char bytes[arm_packed_size];
    static char text[TEXT];
    roln_model other = arm_model;
    uint64_t seed = 5;
    roln_real gain[2], damping[2], offset[2];
    CHECK_OK(arm_init(&p, &seed, &w));
    CHECK_OK(arm_actuator_of(&p, gain, damping, offset));
    CHECK(all(2, gain, 1) && all(2, damping, 0) && all(2, offset, 0)); /* the model of torques */
    CHECK_OK(arm_actuator_of(&p, NULL, NULL, NULL));
    arm_pack(&p, bytes);
    CHECK_OK(arm_unpack(arm_packed_size, bytes, &q));
    CHECK(memcmp(&p, &q, sizeof p) == 0);
    other.actuator = ROLN_TORQUE;
    CHECK(roln_unpack(&other, arm_packed_size, bytes, &q) == ROLN_E_FORMAT);
    CHECK(roln_unpack(&drives_model, arm_packed_size, bytes, &q) == ROLN_E_SHAPE);
    CHECK_OK(arm_write(&p, put_text, text));
    CHECK(strstr(text, "arm_weights_are_of_ROLN_ACTUATOR_current[arm_actuator == 1 ?") != NULL);
}

#ifdef ROLN_DOUBLE
/* Two links, M = [2 + cos q_2 / 5, 1/2 + cos q_2 / 10; .., 1/2], without gravity, at random states. */
enum { SAMPLES = 500 };
static const double true_gain[2] = {2, 5}, true_offset[2] = {0.5, -1}, true_damping[2] = {0.4, 0.5};
static double links_q[2 * SAMPLES], links_qd[2 * SAMPLES], links_qdd[2 * SAMPLES], links_u[2 * SAMPLES];
static roln_batch two_links(int servo, uint64_t *seed)
{
    roln_batch b;
    int i, j;
    for (i = 0; i < SAMPLES; i++) {
        double *const q = links_q + 2 * i, *const qd = links_qd + 2 * i, *const u = links_u + 2 * i;
        double tau[2], c, s, det, off;
        for (j = 0; j < 2; j++) {
            q[j] = 6 * roln_uniform(seed) - 3, qd[j] = roln_normal(seed), u[j] = roln_normal(seed);
            tau[j] = true_gain[j] * u[j] + true_offset[j] - (servo ? true_damping[j] * qd[j] : 0);
            if (servo) u[j] = q[j] + remainder(u[j], 6.283185307179586);
        }
        c = cos(q[1]) / 10, s = sin(q[1]) / 10, off = 0.5 + c, det = (2 + 2 * c) * 0.5 - off * off;
        tau[0] += s * (2 * qd[0] * qd[1] + qd[1] * qd[1]), tau[1] -= s * qd[0] * qd[0];
        links_qdd[2 * i] = (0.5 * tau[0] - off * tau[1]) / det;
        links_qdd[2 * i + 1] = ((2 + 2 * c) * tau[1] - off * tau[0]) / det;
    }
    memset(&b, 0, sizeof b);
    b.count = SAMPLES, b.stride = 1, b.q = links_q, b.qd = links_qd, b.qdd = links_qdd, b.tau = links_u;
    return b;
}

/* The ratios of gains and what is in parts of a gain, all that motion tells, against those of the machine. */
#define LEARN(name, servo) \
    static void test_##name(void) \
    { \
        static name##_params p; \
        static name##_start start; \
        static name##_train w; \
        static name##_gradient g; \
        static name##_optimiser o; \
        const roln_loss wt = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0}; \
        roln_opt opt = ROLN_OPT(1e-2, 1e-2); \
        uint64_t seed = 9; \
        const roln_batch b = two_links(servo, &seed); \
        double gain[2], damping[2], offset[2]; \
        int it, j; \
        CHECK_OK(name##_init(&p, &seed, &start.init)); \
        CHECK_OK(name##_fit_inertia(&p, &b, &w.fit_inertia)); \
        CHECK_OK(name##_ignore(&p, 0)); /* no gravity */ \
        for (it = 0; it < 3000; it++) { \
            opt.lr[1] = it < 1500 ? 1e-2 : it < 2500 ? 2e-3 : 5e-4; \
            memset(&g, 0, sizeof g); \
            CHECK_OK(name##_grad_acc(&p, &wt, &b, &g, &w.grad_acc)); \
            CHECK_OK(name##_update(&p, &opt, &o, &g, &w.update)); \
        } \
        CHECK_OK(name##_actuator_of(&p, gain, damping, offset)); \
        BOUND("learned ratio of gains", fabs(gain[1] / gain[0] / (true_gain[1] / true_gain[0]) - 1), 0.02); \
        for (j = 0; j < 2; j++) { \
            BOUND("learned offset", fabs(offset[j] / gain[j] / (true_offset[j] / true_gain[j]) - 1), 0.02); \
            if (servo) BOUND("learned damping", fabs(damping[j] / gain[j] / (true_damping[j] / true_gain[j]) - 1), 0.02); \
        } \
    }
LEARN(arm, 0)
LEARN(drives, 1)
#endif

void TEST_NAME(actuator)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        uint64_t s = 800 + (uint64_t)k;
        parameters(k, &s, theta_k);
        check_step(k, 0, force_of, &s);
        test_motors(k, &s);
        test_own_units(k, &s);
        check_slopes(k, &s);
#ifdef ROLN_DOUBLE
        check_gradient(k, ODE, &s);
        check_gradient(k, ACC, &s);
        check_gradient(k, ACC_STARTS, &s);
        check_rows(k, ODE, &s);
        check_rows(k, ACC, &s);
        check_gradient(k, VAR, &s);
        check_load_jacobian(k, &s);
        check_jacobian(models[k], scale_of(k), &s);
        check_jacobian(others[0][k], scale_of(k), &s);
        check_jacobian(others[1][k], scale_of(k), &s);
        check_jacobian(others[2][k], scale_of(k), &s);
#endif
        test_inputs(k, &s);
        parameters(k, &s, theta_k);
        test_lift(k, &s);
    }
    test_oscillation();
    test_power();
    test_lift_failing();
    test_kept();
#ifdef ROLN_DOUBLE
    test_arm();
    test_drives();
#endif
    print_bounds();
}
