/* SPDX-License-Identifier: MIT */
#include "offline.h"

#include <math.h>
#include <string.h>

#define SWIFT_STEPS 60
#include "swift.h"

enum { N = SWIFT_N, n = 4, MOTORS = SWIFT_MOTORS, STEPS = OFFLINE_STEPS };
static swift_params params;
static swift_plan none; /* no torques: u0 is given */
static swift_plan_next_work scratch;

int offline_load(int count, const float *numbers)
{
    roln_real *const p = (roln_real *)&params;
    if (count != swift_numbers) return -1;
    for (int i = 0; i < count; i++)
        p[i] = (double)numbers[i];
    params.slope = swift_model.ae.slope,
    params.eigenvalue_floor = swift_model.lnn.eigenvalue_floor; /* of the config, not rounded to float */
    return 0;
}

/* What swift_plan_next works on, of one problem. */
static struct {
    roln_real weight[N], slow[N], dear[MOTORS], ref[N], still[N];
    roln_term terms[2];
    roln_limits limits;
    roln_motors motors;
    roln_goal goal;
} t;

/* From the start, with the torques u. */
static void prepare(const struct offline *o, const float *u)
{
    static const roln_real B[N * MOTORS] = SWIFT_B;
    for (int i = 0; i < N; i++)
        t.weight[i] = SWIFT_Q, t.slow[i] = SWIFT_QD, t.ref[i] = o->q[i];
    for (int j = 0; j < MOTORS; j++)
        t.dear[j] = SWIFT_U(o->limit);
    t.terms[0] = (roln_term){.of = ROLN_OF_Q, .weight = t.weight, .ref = t.ref};
    t.terms[1] = (roln_term){.of = ROLN_OF_QD, .weight = t.slow, .ref = t.still};
    t.motors = (roln_motors){MOTORS, B, 0};
    t.limits = (roln_limits){.dt = SWIFT_DT, .margin = 100, .tau = o->limit, .motors = &t.motors};
    t.goal = (roln_goal){.dt = SWIFT_DT, .terms = 2, .term = t.terms, .u = t.dear, .limits = &t.limits, .iterations = 25,
                         .P = o->P, .end = o->end};
    rolni_copy(2 * n, o->start, scratch.s0);
    swift_i_plan_start(&t.goal, &none, &scratch);
    for (int i = 0; i < STEPS * MOTORS; i++)
        scratch.u0[i] = (double)u[i];
}

double offline_cost(const struct offline *o, const float *u)
{
    roln_real cost;
    int in;
    prepare(o, u);
    return swift_i_plan_base(&params, &t.goal, &none, 0, &cost, &in, &scratch) == ROLN_OK ? cost : (double)NAN;
}

double offline_best(const struct offline *o, const float *u)
{
    roln_real cost = (roln_real)NAN, before = (roln_real)INFINITY, gap;
    prepare(o, u);
    for (int k = 0; k < 200; k++) { /* a step that is no better leaves u1 = u0 and the cost */
        memset(none.of, 0, sizeof none.of); /* derivatives of this step */
        if (swift_i_plan_better(&params, &t.goal, &none, 0, &cost, &gap, &scratch) != ROLN_OK) return (double)NAN;
        rolni_copy(STEPS * MOTORS, scratch.u1, scratch.u0);
        if (!(cost < before * (1 - 1e-9))) break;
        before = cost;
    }
    return cost;
}
