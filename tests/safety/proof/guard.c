/* SPDX-License-Identifier: MIT */
/* guard.c - whatever the bits of parameters, measurement, latent state, wanted torques, guard and scratch, each torque that
   NAME_guard_tick leaves is finite and within its limit. */

#include "eva.h"
#include "pend2.h"

#define limits arm_tick_limits
#define controller arm_controller
#define controller_tick arm_controller_tick
#include "arm_tick.h"
#undef limits
#undef controller
#undef controller_tick
#include "furuta_tick.h" /* limits, motors */

volatile int any;

#define GUARD(name, count) \
    static name##_params name##_any; \
    static name##_state name##_x; \
    static name##_latent name##_s; \
    static name##_guard name##_held; \
    static name##_guard_tick_work name##_scratch; \
    static roln_real name##_want[count]; \
    static void name##_proof(const roln_limits *l, const roln_real *top) \
    { \
        int i; \
        EVA_ANY(name##_any), EVA_ANY(name##_x), EVA_ANY(name##_s), EVA_ANY(name##_held), EVA_ANY(name##_scratch); \
        EVA_ANY(name##_want); \
        name##_guard_tick(&name##_any, l, &name##_x, any ? &name##_s : NULL, any ? name##_want : NULL, &name##_held, \
                          &name##_scratch); \
        for (i = 0; i < count; i++) \
            may_go_to_a_motor(name##_held.tau[i], top[i]); \
    }
GUARD(furuta, 1)
GUARD(arm, arm_N)
GUARD(pend2, 2)

static roln_real safe[2]; /* any bits */
static const roln_real torque[1] = {TORQUE}, each[2] = {60, 0.5f}, rate[2] = {1000, 0};
/* every check; and faults in place of clipping, limits of rate */
static const roln_limits checks = {.dt = 0.001f, .margin = 0.05f, .residual = 3, .tau_each = each, .hold = 3, .q_tolerance = 0.05f,
                                   .qd_tolerance = 1, .residual_window = 10, .safe = safe};
static const roln_limits strict = {.dt = 0.001f, .margin = 0.05f, .tau_each = each, .hold = 3, .strict = 1, .rate_each = rate,
                                   .safe = safe};

int main(void)
{
    EVA_ANY(safe);
    furuta_proof(&limits, torque);
    arm_proof(&arm_tick_limits, most);
    pend2_proof(&checks, each);
    pend2_proof(&strict, each);
    /*@ assert ended: \true; */
    return 0;
}
