/* SPDX-License-Identifier: MIT */
/* swing - the Furuta pendulum of examples/mpc.c from a hundred random states: by plans on the learned model from encoders, and by
   the same plans on the true model, of which every state is known.
     swing           from the top of the repository: 100 states
     swing test      20 */
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized" /* gcc 12 says so of y in planner_tick, which is initialised */
int mpc_main(int argc, char **argv);
#define main mpc_main
#include "../../examples/mpc.c"
#undef main
#include "../unit/check.h"

enum { AHEAD = furuta_steps, N2 = 4 }; /* steps of a plan */

/* ---- 1 the true model ---- */

/* x [4] = [q; qd] a step of the plans on. */
static void true_step(double x[N2], double torque)
{
    motion s = {{x[0], x[1]}, {x[2], x[3]}};
    for (int i = 0; i < EVERY; i++)
        advance(&s, torque, (double)TICK);
    x[0] = s.q[0], x[1] = s.q[1], x[2] = s.qd[0], x[3] = s.qd[1];
}

/* The cost of x and u, u in units of the limit; its gradient by x. The Hessian is 2 weight. */
static double true_cost(const double x[N2], double u, double gradient[N2])
{
    double sum = (double)u_weight[0] * (double)(TORQUE * TORQUE) * u * u;
    for (int i = 0; i < N2; i++) {
        const double w = (double)(i < 2 ? q_weight[i] : qd_weight[i - 2]);
        const double e = i < 2 ? remainder(x[i] - (double)q_ref[i], TURN) : x[i] - (double)qd_ref[i - 2];
        sum += w * e * e, gradient[i] = 2 * w * e;
    }
    return sum;
}

/* Steps of a plan: states s [AHEAD + 1], torques u. */
typedef struct { double s[AHEAD + 1][N2], u[AHEAD]; } course;

static double clip(double u)
{
    return fmax(-1, fmin(1, u));
}

/* u = to->u + part of (u - to->u) with feedback to to->s + part x, and what comes of it; its cost. */
static double roll(const course *to, double part, const roln_real *u, const roln_real *x, const roln_real *K, course *c)
{
    double sum = 0, none[N2];
    memcpy(c->s[0], to->s[0], sizeof c->s[0]);
    for (int k = 0; k < AHEAD; k++) {
        double now = to->u[k] + part * ((double)u[k] - to->u[k]);
        for (int i = 0; i < N2; i++)
            now -= (double)K[k * N2 + i] * (c->s[k][i] - to->s[k][i] - part * (double)x[k * N2 + i]);
        c->u[k] = clip(now);
        memcpy(c->s[k + 1], c->s[k], sizeof c->s[k]);
        true_step(c->s[k + 1], c->u[k] * (double)TORQUE);
        sum += true_cost(c->s[k + 1], c->u[k], none);
    }
    return sum;
}

static struct {
    roln_real A[AHEAD * N2 * N2], B[AHEAD * N2], Q[AHEAD * N2 * N2], q[AHEAD * N2], r[1], hold[1], at[AHEAD];
    roln_real u[AHEAD], x[(AHEAD + 1) * N2], K[AHEAD * N2], work[ROLN_OCP_WORK(N2, 1, AHEAD, 0)];
} solver;

/* From x on under the last plan with its feedback, and the derivatives there, by central differences; its cost. */
static double true_base(const furuta_plan *last, const double x[N2], course *c)
{
    double sum = 0;
    memcpy(c->s[0], x, sizeof c->s[0]);
    for (int k = 0; k < AHEAD; k++) {
        double u = 0, gradient[N2];
        if (last->plan.valid) u = (double)(last->u[k + 1 < AHEAD ? k + 1 : k] / TORQUE);
        for (int i = 0; i < N2 && last->plan.valid && k + 1 < AHEAD; i++) {
            const double to = (double)(i < 2 ? last->s[k + 1].z[i] : last->s[k + 1].zd[i - 2]), e = c->s[k][i] - to;
            u -= (double)(last->K[(k + 1) * N2 + i] / TORQUE) * (i < 2 ? remainder(e, TURN) : e);
        }
        c->u[k] = clip(u);
        for (int j = 0; j <= N2; j++) { /* by u after all of x */
            double plus[N2], minus[N2];
            const double h = 1e-4;
            memcpy(plus, c->s[k], sizeof plus), memcpy(minus, c->s[k], sizeof minus);
            if (j < N2) plus[j] += h, minus[j] -= h;
            true_step(plus, (c->u[k] + (j == N2) * h) * (double)TORQUE);
            true_step(minus, (c->u[k] - (j == N2) * h) * (double)TORQUE);
            for (int i = 0; i < N2; i++)
                *(j < N2 ? &solver.A[(k * N2 + i) * N2 + j] : &solver.B[k * N2 + i]) = (roln_real)((plus[i] - minus[i]) / (2 * h));
        }
        memcpy(c->s[k + 1], c->s[k], sizeof c->s[k]);
        true_step(c->s[k + 1], c->u[k] * (double)TORQUE);
        sum += true_cost(c->s[k + 1], c->u[k], gradient);
        for (int i = 0; i < N2; i++) {
            solver.q[k * N2 + i] = (roln_real)gradient[i];
            for (int j = 0; j < N2; j++)
                solver.Q[(k * N2 + i) * N2 + j] = i != j ? 0 : 2 * (i < 2 ? q_weight[i] : qd_weight[i - 2]);
        }
        solver.at[k] = (roln_real)c->u[k];
    }
    return sum;
}

/* As NAME_plan_next on the learned model. */
static void true_plan(const double x[N2], furuta_plan *p)
{
    static course base, c;
    const double before = true_base(p, x, &base);
    const roln_ocp o = {.n = N2, .m = 1, .steps = AHEAD, .A = solver.A, .B = solver.B, .Q = solver.Q, .q = solver.q,
                        .r = solver.r, .ref = solver.hold, .at = solver.at};
    double part = 1;
    solver.r[0] = 2 * u_weight[0] * TORQUE * TORQUE, solver.hold[0] = 0;
    p->plan.valid = 1, p->plan.age = 0;
    if (roln_ocp_solve(&o, 6, solver.u, solver.x, solver.K, NULL, solver.work) != ROLN_OK) exit(1);
    while (part > 0.2 && !(roll(&base, part, solver.u, solver.x, solver.K, &c) <= before))
        part /= 2;
    if (part < 0.2) c = base;
    for (int k = 0; k <= AHEAD; k++)
        for (int i = 0; i < N2; i++)
            *(i < 2 ? &p->s[k].z[i] : &p->s[k].zd[i - 2]) = (roln_real)c.s[k][i];
    for (int k = 0; k < AHEAD; k++)
        p->u[k] = (roln_real)c.u[k] * TORQUE;
    for (int k = 0; k < AHEAD * N2; k++)
        p->K[k] = solver.K[k] * TORQUE;
}

/* ---- 2 loops ---- */

/* 3 s from s. When was it upright for good? -1: it was not. */
static double swing_up(motion s, int learned)
{
    static furuta_plan p;
    double since = 0, tilt = 0;
    memset(&mpc, 0, sizeof mpc), memset(&p, 0, sizeof p), mpc.age = EVERY;
    for (int t = 0; t < TICKS; t++) {
        int count[2];
        double torque;
        for (int i = 0; i < 2; i++)
            count[i] = (int)floor(s.q[i] / TURN * STEPS + 0.5);
        if (learned) {
            (void)planner_tick(&mpc, count);
            torque = (double)mpc.guard.tau[0];
        } else {
            const furuta_latent x = {{(roln_real)s.q[0], (roln_real)s.q[1]}, {(roln_real)s.qd[0], (roln_real)s.qd[1]}};
            const double now[N2] = {s.q[0], s.q[1], s.qd[0], s.qd[1]};
            roln_real u = 0;
            if (t % EVERY == 0) true_plan(now, &p);
            if (furuta_plan_follow(&furuta_weights, &goal, &p, TICK * (roln_real)(t % EVERY), &x, &u) != ROLN_OK) exit(1);
            torque = (double)u;
        }
        for (int i = 0; i < 2; i++)
            advance(&s, torque, (double)TICK / 2);
        tilt = fabs(remainder(s.q[1] - TURN / 2, TURN));
        if (tilt > 0.3) since = (t + 1) * (double)TICK;
    }
    return tilt < 0.05 ? since : -1;
}

int main(int argc, char **argv)
{
    static double when[2][100];
    const int count = argc > 1 && strcmp(argv[1], "test") == 0 ? 20 : 100;
    uint64_t seed = 2;
    int up[2] = {0, 0};
    printf("upright for good, of %d states within .6 rad and .6 rad/s of hanging:\n", count);
    for (int k = 0; k < count; k++) {
        motion s;
        for (int i = 0; i < 2; i++) {
            s.q[i] = 1.2 * ((double)roln_uniform(&seed) - 0.5);
            s.qd[i] = 1.2 * ((double)roln_uniform(&seed) - 0.5);
        }
        for (int learned = 0; learned < 2; learned++) {
            const double since = swing_up(s, learned);
            if (since >= 0) when[learned][up[learned]++] = since;
        }
    }
    for (int learned = 0; learned < 2; learned++) {
        double *const w = when[learned];
        qsort(w, (size_t)up[learned], sizeof *w, larger);
        printf("  %s %d, median after %.2f s, last after %.2f s\n", learned ? "learned model, encoders and filter:" :
               "true model, states known:          ", up[learned], w[up[learned] / 2], w[up[learned] > 0 ? up[learned] - 1 : 0]);
    }
    CHECK(up[0] == count);
    CHECK(up[1] == count);
    CHECK_BELOW(when[1][up[1] / 2], 1.2 * when[0][up[0] / 2]);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
