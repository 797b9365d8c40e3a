/* SPDX-License-Identifier: MIT */
/* plan.c - plans of any bits in parameters, state, goal, the plan itself, time and scratch: nothing undefined, and torques of
   NAME_plan_follow, and all torques of a plan of NAME_plan_next, are finite and within their limits if the status is ROLN_OK; with
   limits of rate and without, with a reserve and without. The model's step, its derivatives and the solver stand there as functions
   that write any bits and return any status. */

#include "eva.h"

#define ROLN_NAME cart
#define ROLN_AE 1
#define ROLN_MLP 2
#define ROLN_INTEGRATOR leapfrog
#define ROLN_PLAN 2, 1
#include "roln.h"

enum { MOTORS = cart_motors, STEPS = cart_steps };
static const roln_real top[MOTORS] = {0.5f}, rate[MOTORS] = {100};
static const roln_limits limits = {.dt = 0.001f, .margin = 0.05f, .tau_each = top};
static const roln_limits rated = {.dt = 0.001f, .margin = 0.05f, .tau_each = top, .rate_each = rate};
static roln_real weight[1], ref[1], cost[MOTORS], hold[MOTORS], load[cart_n], P[4 * cart_n * cart_n], end[2 * cart_n];
static roln_real low[1], high[1], tighten[STEPS], reserve[STEPS * MOTORS];
static cart_params params;
static cart_latent s;
static cart_plan plan;
static cart_plan_next_work work;
volatile int any;

/*@ assigns z[0 .. cart_n - 1], zd[0 .. cart_n - 1], *w, \result \from \nothing;
    ensures status: \result <= 0; */
static roln_status cart_i_step(const cart_params *p, roln_real *z, roln_real *zd, const rolni_push *by, cart_step_work *w);

/*@ assigns s[0 .. 2 * cart_n - 1], A[0 .. 4 * cart_n * cart_n - 1], B[0 .. 2 * cart_n * MOTORS - 1], *w, \result \from \nothing;
    ensures status: \result <= 0; */
static roln_status cart_i_linear_motors(const cart_params *p, const rolni_acting *by, roln_real *s, roln_real *A, roln_real *B,
                                        cart_i_linear_motors_work *w);

/*@ assigns u[0 .. STEPS * MOTORS - 1], x[0 .. 2 * cart_n * (STEPS + 1) - 1], K[0 .. 2 * cart_n * STEPS * MOTORS - 1], *gap,
            work[0 .. ROLN_OCP_WORK(2 * cart_n, MOTORS, STEPS, 1) - 1], \result \from \nothing;
    ensures status: \result <= 0; */
static roln_status roln_ocp_solve(const roln_ocp *p, int iterations, roln_real *u, roln_real *x, roln_real *K, roln_real *gap,
                                  roln_real *work);

/* A goal of any numbers, of one term that may be a limit. */
static roln_goal any_goal(const roln_limits *of, const roln_real *holds, const roln_real *leaves)
{
    static roln_term term[1];
    const int limited = any;
    roln_goal goal;
    EVA_ANY(goal), EVA_ANY(term), EVA_ANY(weight), EVA_ANY(ref), EVA_ANY(cost), EVA_ANY(hold), EVA_ANY(load), EVA_ANY(P);
    EVA_ANY(end), EVA_ANY(low), EVA_ANY(high), EVA_ANY(tighten), EVA_ANY(reserve);
    term[0].C = NULL, term[0].weight = weight, term[0].ref = ref, term[0].moving = 0;
    term[0].low = limited ? low : NULL, term[0].high = limited ? high : NULL, term[0].tighten = limited ? tighten : NULL;
    goal.terms = 1, goal.term = term, goal.u = cost, goal.hold = holds, goal.reserve = leaves, goal.limits = of;
    goal.P = P, goal.end = end, goal.load = load;
    return goal;
}

static void follow(const roln_limits *of)
{
    const roln_goal goal = any_goal(of, NULL, NULL);
    roln_real t, u[MOTORS];
    int j;
    EVA_ANY(params), EVA_ANY(s), EVA_ANY(plan), EVA_ANY(t);
    if (cart_plan_follow(&params, &goal, &plan, t, &s, u) != ROLN_OK) return;
    for (j = 0; j < MOTORS; j++)
        may_go_to_a_motor(u[j], top[j]);
}

static void next(const roln_limits *of, const roln_real *holds, const roln_real *leaves)
{
    const roln_goal goal = any_goal(of, holds, leaves);
    int i;
    EVA_ANY(params), EVA_ANY(s), EVA_ANY(plan), EVA_ANY(work);
    /*@ admit apart: plan.plan.age < 0 || plan.plan.age == 0 || plan.plan.age == 1 || plan.plan.age > 1; */
    if (cart_plan_next(&params, &goal, &s, &plan, &work) != ROLN_OK) return;
    for (i = 0; i < STEPS * MOTORS; i++)
        may_go_to_a_motor(plan.u[i], top[i % MOTORS]);
}

int main(void)
{
    follow(&limits), follow(&rated);
    next(&limits, NULL, NULL), next(&limits, hold, reserve), next(&rated, NULL, NULL), next(&rated, hold, reserve);
    /*@ assert ended: \true; */
    return 0;
}
