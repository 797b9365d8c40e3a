/* SPDX-License-Identifier: MIT */
/* tick.c - NAME_tick, a whole control tick of a double pendulum, of any bits in parameters, measurement, reference, gains, latent
   state, guard and scratch: nothing undefined, and torques as in guard.c. */

#include "eva.h"
#include "pend2.h"

static const float top[2] = {60, 0.5f};
static const roln_limits limits = {.dt = 0.001f, .margin = 0.05f, .power = 3, .tau_each = top, .hold = 3, .q_off = 0.05f,
                                   .qd_off = 1, .window = 10};
static pend2_params params;
static pend2_state x;
static pend2_target ref;
static pend2_latent s;
static pend2_guard guard;
static pend2_work work;

int main(void)
{
    EVA_ANY(params), EVA_ANY(x), EVA_ANY(ref), EVA_ANY(s), EVA_ANY(guard), EVA_ANY(work);
    pend2_tick(&params, &limits, &x, &ref, &s, &guard, &work);
    /*@ assert finite: \is_finite(guard.tau[0]) && \is_finite(guard.tau[1]); */
    /*@ assert within: -60 <= guard.tau[0] <= 60 && -0.5 <= guard.tau[1] <= 0.5; */
    return 0;
}
