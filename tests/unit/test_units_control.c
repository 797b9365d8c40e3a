/* SPDX-License-Identifier: MIT */
/* Joints with units of their own (ROLN_SCALE each), powers of two: feedback, estimates and ticks of a controller with its guard
   give the bits that they give for joints that were scaled by hand. */

#define CALLED(X) X(lqr) X(filter_tick) X(tick) X(fit_limits)
/* The small models with joints in units of their own. */
#define SMALL(name) name##_own
#define SMALL_SCALE each
#include "small_models.h"

#include "small.h"
#include "units.h"

void TEST_NAME(units_control)(void);

/* Feedback of motors at every joint, or of learned inputs: weights q_j / each_j^2, u_j each_j^2. */
static void test_feedback(int k)
{
    static pair p;
    static roln_real K[2][2 * MAXN * MAXN], w[2][3 * MAXN], P[2][256];
    roln_real s0[2 * MAXN] = {0};
    uint64_t s = 30 + (uint64_t)k;
    int i, F;
    pair_of(k, &s, &p), F = p.F;
    dyadic(p.n, ROLN_C(0.5), &s, s0);
    for (i = 0; i < 3 * MAXN; i++)
        w[0][i] = 1 + ROLN_C(0.125) * (roln_real)(i % 3);
    for (i = 0; i < F && k == DEEP; i++)
        w[0][2 * p.N + i] = ROLN_C(1e6);
    in_units(&p, -2, 2, w[0], w[1]);
    if (p.inputs > 0) memcpy(w[1] + 2 * p.N, w[0] + 2 * p.N, (size_t)F * sizeof *w[0]);
    else in_units(&p, 2, 1, w[0] + 2 * p.N, w[1] + 2 * p.N);
    for (i = 0; i < 2; i++) {
        const roln_cost cost = {.q = w[i], .qd = w[i] + p.N, .u = w[i] + 2 * p.N, .dt = dt};
        const instance *m = i ? &p.own : &p.plain;
        CHECK_OK(m->of->lqr(m, &cost, s0, NULL, K[i], P[i], ROOM(lqr)));
    }
    for (i = 0; i < 2 * p.n * F; i++)
        K[0][i] /= p.inputs > 0 ? 1 : p.each[i / (2 * p.n)];
    CHECK(same(2 * p.n * F, K[0], K[1]) && same(4 * p.n * p.n, P[0], P[1]));
}

/* Ticks of a filter: a torque that nobody knows is tau / each_j on the joints of the second. */
static void test_estimates(int k)
{
    static pair p;
    static roln_real F[2][9 * MAXN * MAXN];
    roln_real y[2][MAXN], tau[2][MAXN], q_each[2][MAXN], z[2][2 * MAXN], load[2][MAXN] = {{0}};
    roln_filter f[2];
    uint32_t faults[2];
    uint64_t s = 60 + (uint64_t)k;
    int i, t, side;
    pair_of(k, &s, &p), side = (2 + models[k]->load) * p.n;
    memset(f, 0, sizeof f);
    fill(MAXN, ROLN_C(0.125), q_each[0]), in_units(&p, 1, 1, q_each[0], q_each[1]);
    dyadic(p.N, ROLN_C(0.25), &s, y[0]);
    for (t = 0; t < 4; t++) {
        y[0][0] += ROLN_C(0.0625);
        dyadic(p.F, ROLN_C(0.25), &s, tau[0]);
        in_units(&p, 1, 1, y[0], y[1]), force_in_units(&p, 1, tau[0], tau[1]);
        for (i = 0; i < 2; i++) {
            const roln_noise noise = {.dt = dt, .tau = ROLN_C(0.5), .q_each = q_each[i]};
            const filter_at to = {&f[i], z[i], z[i] + p.n, F[i], load[i], NULL};
            const instance *m = i ? &p.own : &p.plain;
            faults[i] = m->of->filter_tick(m, &noise, y[i], tau[i], &to, ROOM(filter_tick));
        }
        CHECK(faults[0] == faults[1] && f[0].valid && same(1, &f[0].nis, &f[1].nis) && (t > 0 || (faults[0] & ROLN_FILTER_START)));
        CHECK(same(2 * p.n, z[0], z[1]) && same(side * side, F[0], F[1]) && same(p.n, load[0], load[1]));
    }
}

/* Ticks of a controller, and what the guard sees in them: the energy balance is the same, torques are each in its unit. */
static void test_ticks(int k)
{
    enum { TICKS = 4 };
    static pair p;
    static roln_real q[2][2 * TICKS * MAXN], all_tau[2][TICKS * MAXN];
    roln_real ref[5 * MAXN], tau[2][MAXN] = {{0}}, z[2][2 * MAXN], most[2][2 * MAXN];
    roln_guard g[2] = {{.valid = 0}, {.valid = 0}};
    roln_limits fit[2] = {{.dt = dt}, {.dt = dt}};
    const roln_limits limits = {.dt = dt, .margin = 1, .residual = 1000, .tau = ROLN_C(1e6), .hold = 1};
    uint64_t s = 40 + (uint64_t)k;
    int N, i, j;
    pair_of(k, &s, &p), N = p.N;
    dyadic(5 * MAXN, ROLN_C(0.25), &s, ref), dyadic(2 * TICKS * N, ROLN_C(0.25), &s, q[0]), in_units(&p, 1, 2 * TICKS, q[0], q[1]);
    for (i = 0; i < TICKS; i++) {
        uint32_t faults[2];
        for (j = 0; j < 2; j++) {
            const instance *m = j ? &p.own : &p.plain;
            const target_at target = {ref, ref + p.n, ref + 2 * p.n, ref + 3 * p.n, ref + 4 * p.n, NULL};
            const guard_at held = {&g[j], tau[j]};
            const roln_motors damped = {.mu = 1};
            roln_limits l = limits;
            if (p.inputs > 0) l.motors = &damped;
            faults[j] = m->of->tick(m, &l, q[j] + 2 * i * N, q[j] + (2 * i + 1) * N, &target, z[j], z[j] + p.n, &held, ROOM(tick));
        }
        CHECK(faults[0] == faults[1] && same(2 * p.n, z[0], z[1]) && g[0].valid && g[1].valid);
        CHECK(same(1, &g[0].residual, &g[1].residual) && same(1, &g[0].power, &g[1].power) && (i == 0 || g[1].residual != 0));
        force_in_units(&p, 1, tau[0], ref + 4 * MAXN);
        CHECK(same(p.F, ref + 4 * MAXN, tau[1]) && largest(p.F, tau[1]) > 0);
        memcpy(all_tau[0] + i * p.F, tau[0], sizeof tau[0]), memcpy(all_tau[1] + i * p.F, tau[1], sizeof tau[1]);
    }
    for (j = 0; j < 2; j++) {
        static roln_real x[2][TICKS * MAXN];
        const roln_batch b = {.count = 1, .steps = TICKS - 1, .stride = 1, .q = x[0], .qd = x[1], .tau = all_tau[j]};
        const instance *m = j ? &p.own : &p.plain;
        for (i = 0; i < 2 * TICKS; i++)
            memcpy(x[i % 2] + i / 2 * N, q[j] + i * N, (size_t)N * sizeof *x[0]);
        CHECK_OK(m->of->fit_limits(m, &b, 2, &fit[j], most[j], most[j] + p.F, ROOM(fit_limits)));
    }
    force_in_units(&p, 2, most[0], most[0]);
    CHECK(same(2 * p.F, most[0], most[1]) && same(1, &fit[0].margin, &fit[1].margin) &&
          same(1, &fit[0].residual, &fit[1].residual));
}

void TEST_NAME(units_control)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_feedback(k);
        test_estimates(k);
        test_ticks(k);
    }
    print_bounds();
}
