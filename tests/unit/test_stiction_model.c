/* SPDX-License-Identifier: MIT */
/* ROLN_STICTION of a model: the weights and bytes of the model without it, steps and derivatives that hold joints, roll-out errors,
   the state ahead, estimates of a joint that stands, feedback and plans that move it. */
#define ROLN_NAME soft
#define ROLN_AE 2
#define ROLN_MLP 4
#define ROLN_ANGLES 1, 0
#define ROLN_FRICTION 1
#define ROLN_LOAD 1
#define ROLN_DELAY 2
#define ROLN_PLAN 10, 2
#include "roln.h"
#define ROLN_NAME hard
#define ROLN_AE 2
#define ROLN_MLP 4
#define ROLN_ANGLES 1, 0
#define ROLN_FRICTION 1
#define ROLN_STICTION 1
#define ROLN_LOAD 1
#define ROLN_DELAY 2
#define ROLN_PLAN 10, 2
#include "roln.h"
#define ROLN_NAME geared /* behind an autoencoder, by the law of drives */
#define ROLN_AE 4, 2
#define ROLN_MLP 4
#define ROLN_FRICTION 2
#define ROLN_STICTION 1
#define ROLN_MASS cholesky
#define ROLN_INTEGRATOR midpoint
#include "roln.h"

#include "twin.h"

void TEST_NAME(stiction_model)(void);

static const roln_real dt = ROLN_C(0.015625);

/* Scratch of hard, with numbers behind it that nothing writes. */
static struct {
    hard_step_work step;
    roln_real behind_step[2];
    hard_linear_work linear;
    roln_real behind_linear[2];
    hard_ahead_work ahead;
} room;

static hard_params hard_of(double c)
{
    hard_params p;
    hard_init_work w;
    uint64_t seed = 5;
    int i;
    CHECK(hard_init(&p, &seed, &w) == ROLN_OK);
    p.scale.t = ROLN_C(0.5), p.scale.m = 2, p.dt = dt;
    for (i = 0; i < hard_n; i++) {
        p.z_min[i] = -30, p.z_max[i] = 30, p.zd_max[i] = 300;
        p.theta[rolni_friction_at(&hard_model.lnn) + i] = (roln_real)log(c * (i + 1));
    }
    return p;
}

static soft_params soft_of(const hard_params *p)
{
    soft_params s;
    CHECK(sizeof s == sizeof *p);
    memcpy(&s, p, sizeof s);
    return s;
}

/* Torques that hold s against gravity, and a part of the level beyond them. */
static void torque(const hard_params *p, const hard_latent *s, double part, roln_real *tau)
{
    hard_equation e;
    hard_dynamics_work w;
    roln_real c[hard_n], v[hard_n];
    int i;
    CHECK(hard_dynamics(p, s, &e, &w) == ROLN_OK && hard_friction_of(p, c, v) == ROLN_OK);
    for (i = 0; i < hard_n; i++) tau[i] = e.g[i] + (roln_real)part * c[i];
}

/* The same sizes and bytes as without stiction; training takes the smooth law. */
static void test_bytes(void)
{
    static unsigned char bytes[2][hard_packed_size];
    const hard_params p = hard_of(0.2);
    const soft_params q = soft_of(&p);
    const hard_latent s = {{ROLN_C(0.3), ROLN_C(-0.2)}, {ROLN_C(0.7), ROLN_C(0.1)}};
    soft_latent as;
    hard_equation e[1];
    soft_equation d[1];
    hard_dynamics_work w;
    soft_dynamics_work ws;
    CHECK(sizeof bytes[0] == soft_packed_size && sizeof(hard_grad_work) == sizeof(soft_grad_work));
    hard_pack(&p, bytes[0]), soft_pack(&q, bytes[1]);
    CHECK(memcmp(bytes[0], bytes[1], sizeof bytes[0]) == 0);
    memcpy(&as, &s, sizeof as);
    CHECK(hard_dynamics(&p, &s, e, &w) == ROLN_OK && soft_dynamics(&q, &as, d, &ws) == ROLN_OK);
    CHECK(memcmp(e, d, sizeof e) == 0 && e[0].d[0] > 0);
}

/* Below the level it stands to the bit, above it moves; the model without stiction creeps. Ahead, too. */
static void test_step(void)
{
    const hard_params p = hard_of(0.2);
    const soft_params q = soft_of(&p);
    const hard_latent rest = {{ROLN_C(0.3), ROLN_C(-0.2)}, {0, 0}};
    const roln_limits limits = {.dt = dt, .tau = 100};
    hard_latent s = rest;
    soft_latent creeps;
    static soft_step_work soft;
    hard_guard g;
    roln_real tau[hard_N];
    int k;
    memcpy(&creeps, &rest, sizeof creeps);
    memset(&room, 0, sizeof room), memset(&g, 0, sizeof g);
    torque(&p, &rest, 0.99, tau);
    for (k = 0; k < 1000; k++) CHECK(hard_step(&p, &s, tau, dt, &room.step) == ROLN_OK);
    CHECK(memcmp(&s, &rest, sizeof s) == 0);
    CHECK(soft_step(&q, &creeps, tau, dt, &soft) == ROLN_OK && creeps.zd[0] > 0);
    memcpy(g.tau, tau, sizeof tau), memcpy(g.sent, tau, sizeof tau), memcpy(g.sent[1], tau, sizeof tau);
    CHECK(hard_ahead(&p, &limits, &g, NULL, &s, &room.ahead) == ROLN_OK && memcmp(&s, &rest, sizeof s) == 0);
    torque(&p, &rest, 1.01, tau);
    CHECK(hard_step(&p, &s, tau, dt, &room.step) == ROLN_OK && s.zd[0] > 0 && s.zd[1] > 0 && s.z[0] > rest.z[0]);
    s = rest;
    CHECK(hard_step(&p, &s, tau, -dt, &room.step) == ROLN_E_RANGE && memcmp(&s, &rest, sizeof s) == 0);
    CHECK(room.behind_step[0] == 0 && room.behind_linear[0] == 0);
}

/* One joint is held and one slides: rows of the held one, and differences of NAME_step. */
static void test_linear(void)
{
    const hard_params p = hard_of(0.2);
    const hard_latent from = {{ROLN_C(0.3), ROLN_C(-0.2)}, {0, ROLN_C(0.8)}};
    hard_latent s = from, step = from;
    hard_jacobian J;
    roln_real tau[hard_N];
    int i;
    torque(&p, &from, 0.2, tau);
    memset(&room, 0, sizeof room);
    CHECK(hard_linear(&p, &s, tau, dt, &J, &room.linear) == ROLN_OK);
    CHECK(hard_step(&p, &step, tau, dt, &room.step) == ROLN_OK && memcmp(&s, &step, sizeof s) == 0);
    CHECK(s.z[0] == from.z[0] && s.zd[0] == 0 && s.zd[1] > 0);
    for (i = 0; i < 4; i++) CHECK(J.A[2 * 4 + i] == 0 && J.A[i] == (i == 0 ? 1 : i == 2 ? dt / 2 : 0));
    for (i = 0; i < 2; i++) CHECK(J.B[2 * 2 + i] == 0 && J.B[i] == 0);
    CHECK(J.A[3 * 4 + 3] > ROLN_C(0.5) && J.B[3 * 2 + 1] > 0);
#ifdef ROLN_DOUBLE
    for (i = 0; i < 6; i++) {
        hard_latent at[2];
        double u[2][2];
        int j, r;
        for (j = 0; j < 2; j++) {
            double *x = i < 2 ? at[j].z + i : i < 4 ? at[j].zd + i - 2 : u[j] + i - 4;
            at[j] = from, memcpy(u[j], tau, sizeof tau);
            *x += j ? 1e-4 : -1e-4;
            CHECK(hard_step(&p, at + j, u[j], dt, &room.step) == ROLN_OK);
        }
        for (r = 0; r < 4; r++) {
            const double high = r < 2 ? at[1].z[r] : at[1].zd[r - 2], low = r < 2 ? at[0].z[r] : at[0].zd[r - 2];
            CHECK_NEAR(i < 4 ? J.A[r * 4 + i] : J.B[r * 2 + i - 4], (high - low) / 2e-4, 1e-7);
        }
    }
#endif
    CHECK(room.behind_step[0] == 0 && room.behind_linear[0] == 0);
}

/* Roll-outs are those of NAME_step: motion that it made is predicted to the bit. */
static void test_errors(void)
{
    enum { STEPS = 40 };
    static roln_real q[2 * STEPS + 2][hard_N], qd[2 * STEPS + 2][hard_N];
    static hard_errors_work w;
    static soft_errors_work ws;
    const hard_params p = hard_of(1);
    const soft_params as = soft_of(&p);
    const roln_real mean[hard_N] = {0, 0};
    roln_error e[STEPS + 1], es[STEPS + 1];
    roln_batch b;
    int k, r;
    memset(&b, 0, sizeof b);
    for (r = 0; r < 2; r++) {
        hard_latent s = {{ROLN_C(0.25), ROLN_C(-0.5)}, {r ? ROLN_C(0.125) : 0, ROLN_C(0.5)}};
        for (k = 0; k <= STEPS; k++) {
            memcpy(q[r * (STEPS + 1) + k], s.z, sizeof s.z), memcpy(qd[r * (STEPS + 1) + k], s.zd, sizeof s.zd);
            CHECK(hard_step(&p, &s, NULL, dt, &room.step) == ROLN_OK);
        }
        CHECK(s.zd[0] == 0);
    }
    b.count = 2, b.steps = STEPS, b.stride = 1, b.q = q[0], b.qd = qd[0];
    {
        static const int start[2] = {0, STEPS + 1};
        b.start = start;
        CHECK(hard_errors(&p, &b, dt, 1, mean, &(roln_errors){e, NULL, NULL}, &w) == ROLN_OK);
        CHECK(soft_errors(&as, &b, dt, 1, mean, &(roln_errors){es, NULL, NULL}, &ws) == ROLN_OK);
    }
    CHECK(e[STEPS].q <= 1e-4 * es[STEPS].q && es[STEPS].q > 1e-9);
}

/* A filter on a joint that stands says so. */
static void test_filter(void)
{
    static hard_filter f;
    static hard_filter_tick_work w;
    const hard_params p = hard_of(0.2);
    const hard_latent rest = {{ROLN_C(0.3), ROLN_C(-0.2)}, {0, 0}};
    roln_noise noise;
    roln_real tau[hard_N];
    int k;
    memset(&noise, 0, sizeof noise), memset(&f, 0, sizeof f);
    noise.dt = dt, noise.q = ROLN_C(1e-3), noise.tau = ROLN_C(0.01);
    torque(&p, &rest, 0.5, tau);
    for (k = 0; k < 200; k++) (void)hard_filter_tick(&p, &noise, rest.z, tau, &f, &w);
    CHECK_NEAR(f.s.z[0], 0.3, 1e-4);
    CHECK_NEAR(f.s.zd[0], 0, 1e-3);
    CHECK_NEAR(f.s.zd[1], 0, 1e-3);
}

/* Feedback leaves dry friction out: that of a model without any. */
static void test_lqr(void)
{
    static const roln_real q[hard_N] = {100, 100}, qd[hard_N] = {1, 1}, u[hard_N] = {1, 1};
    static hard_lqr_work w;
    static soft_lqr_work ws;
    const hard_params p = hard_of(0.2);
    soft_params none = soft_of(&p);
    const roln_cost cost = {q, qd, u, dt, NULL};
    const hard_latent s = {{ROLN_C(0.3), ROLN_C(-0.2)}, {0, 0}};
    hard_latent wild = s;
    soft_latent as;
    roln_real K[hard_N * 4], K0[hard_N * 4], P[16];
    int i;
    for (i = 0; i < 16; i++) P[i] = 7;
    memcpy(&as, &s, sizeof as);
    for (i = 0; i < hard_n; i++) none.theta[rolni_friction_at(&hard_model.lnn) + i] = -1000;
    CHECK(hard_lqr(&p, &cost, &s, NULL, K, NULL, &w) == ROLN_OK && soft_lqr(&none, &cost, &as, NULL, K0, NULL, &ws) == ROLN_OK);
    for (i = 0; i < hard_N * 4; i++) CHECK_NEAR(K[i], K0[i], PICK(1e-4, 1e-10));
    memcpy(K0, K, sizeof K);
    wild.zd[0] = PICK(ROLN_C(1e30), ROLN_C(1e200)); /* its step overflows */
    CHECK(hard_lqr(&p, &cost, &wild, NULL, K, P, &w) == ROLN_E_NOT_FINITE && memcmp(K, K0, sizeof K) == 0);
    for (i = 0; i < 16; i++) CHECK(P[i] == 7);
}

/* A plan from rest breaks the joints loose, and its states are those of NAME_step. */
static void test_plan(void)
{
    static hard_plan plan;
    static hard_plan_next_work w;
    static const roln_real each[hard_N] = {100, 100}, ref[hard_N] = {ROLN_C(0.6), ROLN_C(0.2)};
    static const roln_real u[hard_N] = {ROLN_C(0.01), ROLN_C(0.01)};
    const hard_params p = hard_of(0.05);
    const hard_latent rest = {{ROLN_C(0.3), ROLN_C(-0.2)}, {0, 0}};
    const roln_limits limits = {.dt = ROLN_C(0.0625), .tau = 50};
    const roln_term term = {ROLN_OF_Q, hard_N, NULL, each, ref, 0, 5, NULL, NULL, NULL};
    roln_goal goal;
    hard_latent s = rest;
    roln_real hold[hard_N];
    int k;
    memset(&goal, 0, sizeof goal), memset(&plan, 0, sizeof plan);
    torque(&p, &rest, 0, hold);
    goal.dt = limits.dt, goal.terms = 1, goal.term = &term, goal.u = u, goal.hold = hold, goal.limits = &limits;
    for (k = 0; k < 40; k++) {
        hard_latent at = s;
        CHECK(hard_plan_next(&p, &goal, &s, &plan, &w) == ROLN_OK);
        CHECK(hard_step(&p, &at, plan.u, goal.dt, &room.step) == ROLN_OK);
        CHECK(memcmp(plan.s + 1, &at, sizeof at) == 0);
        if (k == 0) CHECK(at.zd[0] > 0 && at.zd[1] > 0);
        s = at;
    }
    CHECK_NEAR(s.z[0], 0.6, 0.05);
    CHECK_NEAR(s.z[1], 0.2, 0.05);
}

/* Behind an autoencoder coordinates of z are held. */
static void test_geared(void)
{
    static geared_params p;
    static union { geared_init_work init; geared_step_work step; geared_linear_work linear; } w;
    const geared_latent rest = {{ROLN_C(0.1), ROLN_C(-0.1)}, {0, 0}};
    geared_latent s = rest, t = rest;
    geared_jacobian J;
    uint64_t seed = 3;
    int i;
    CHECK(geared_init(&p, &seed, &w.init) == ROLN_OK);
    for (i = 0; i < geared_n; i++) p.theta[roln_ae_params(&geared_model.ae) + rolni_friction_at(&geared_model.lnn) + i] = 3;
    CHECK(geared_step(&p, &s, NULL, dt, &w.step) == ROLN_OK && memcmp(&s, &rest, sizeof s) == 0);
    CHECK(geared_linear(&p, &t, NULL, dt, &J, &w.linear) == ROLN_OK && memcmp(&t, &rest, sizeof t) == 0);
    for (i = 0; i < 8; i++) CHECK(J.A[8 + i] == 0 && J.B[8 + i] == 0);
}

void TEST_NAME(stiction_model)(void)
{
    test_bytes();
    test_step();
    test_linear();
    test_errors();
    test_filter();
    test_lqr();
    test_plan();
    test_geared();
    print_bounds();
}
