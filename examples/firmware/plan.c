/* SPDX-License-Identifier: MIT */
/* plan.c - a plan on the board: the learned Furuta pendulum swung up by 50 plans a second, under its torque limit. Its own model,
   a step of 20 ms at a time, stands for the machine, so that the image needs none. Prints what a plan takes, and a hash of all
   torques and gains of 250 plans, which is the same on every core and on the PC.

   sh cc.sh m7 plan.c -o plan.elf && sh run.sh m7 plan.elf */

#include "furuta.h" /* ROLN_PLAN: 30 steps, one motor */
#include "furuta_weights.h"
#include "text.h"

enum { PLANS = 250 };
#define STEP 0.02f /* s */
#define PI 3.14159265f

static furuta_plan plan;         /* RAM */
static furuta_plan_next_work planwork; /* scratch of a plan */
static furuta_work work;

/* As bad as each other: 1 rad of the arm, .3 rad of the pendulum, 5 rad/s, 3 rad/s, .03 Nm. The motor turns the arm. */
static const float ref[2] = {0, PI}, weight[2] = {1, 10}, still[2] = {0, 0}, slow[2] = {0.04f, 0.1f}, dear[1] = {1000};
static const float at_arm[2] = {1, 0};
static const roln_motors motors = {1, at_arm, 0};
static const roln_limits limits = {.dt = STEP, .margin = 1, .tau = 0.04f, .motors = &motors};
static const roln_term terms[2] = {{.of = ROLN_OF_Q, .weight = weight, .ref = ref},
                                   {.of = ROLN_OF_QD, .weight = slow, .ref = still}};
static const roln_goal goal = {.dt = STEP, .terms = 2, .term = terms, .u = dear, .limits = &limits};

int main(void)
{
    furuta_latent s = {{0.1f, 0.05f}, {0, 0}}; /* hanging */
    uint64_t hash = ROLN_FNV;
    uint32_t most = 0, least = 0xffffffff, up = 0, full = 0;
    for (uint32_t k = 0; k < PLANS; k++) {
        const uint32_t before = board_count();
        if (furuta_plan_next(&furuta_weights, &goal, &s, &plan, &planwork) != ROLN_OK) return 1;
        const uint32_t count = board_count() - before;
        float u, tau[2] = {0, 0};
        int at_limit = 0;
        if (count > most) most = count;
        if (count < least) least = count;
        hash = roln_fnv((int)sizeof plan.u, (const unsigned char *)plan.u, hash);
        hash = roln_fnv((int)sizeof plan.K, (const unsigned char *)plan.K, hash);
        for (int i = 0; i < furuta_steps; i++) {
            if (!(ROLN_ABS(plan.u[i]) <= limits.tau)) return 1;
            at_limit |= ROLN_ABS(plan.u[i]) > 0.99f * limits.tau;
        }
        full += at_limit != 0;
        if (furuta_plan_follow(&furuta_weights, &goal, &plan, 0, &s, &u) != ROLN_OK) return 1;
        tau[0] = u;
        if (furuta_step(&furuta_weights, &s, tau, STEP, &work.step) != ROLN_OK) return 1;
        if (ROLN_ABS(roln_wrap(s.z[1] - PI)) > 0.1f || ROLN_ABS(s.zd[1]) > 1) up = k + 1;
    }
    put_text("upright for good after plan ");
    put_integer(up, 0);
    put_text(" of ");
    put_integer(PLANS, 0);
    put_text(", ");
    put_integer(full, 0);
    put_text(" of them at the torque limit\nhash ");
    put_hex(hash, 16);
    put_text("\nbytes of plan and scratch ");
    put_integer((uint32_t)(sizeof plan + sizeof planwork), 0);
    put_text("\ninstructions of a plan ");
    put_integer(least, 0);
    put_text(" .. ");
    put_integer(most, 0);
    put_text("\n");
    return up < PLANS / 2 ? 0 : 1;
}
