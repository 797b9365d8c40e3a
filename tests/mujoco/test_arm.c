/* SPDX-License-Identifier: MIT */
/* The arm of examples/ in MuJoCo: its plant in plain C moves as MuJoCo's does. Its guard refuses what was
   never seen. The controller in the loop: tests/control/machines.c. */
#include <mujoco/mujoco.h>
#include <stdlib.h>

#include "arm_plant.h"
#include "arm_tick.h"
#include "../unit/check.h"
#define M(x) arm_##x
#include "holes.h"

void test_arm(void);

/* From the first tick on a pose that nobody has trained, or a count that does not come: the motors get nothing. because: bits of
   the filter in each tick. */
static void test_no_start(int count, uint32_t because)
{
    static controller ctl;
    const roln_real still[JOINTS] = {0};
    const int counts[JOINTS] = {count, 0, 0, 0, 0, 0};
    memset(&ctl, 0, sizeof ctl);
    for (int k = 0; k < 20; k++) {
        const uint32_t faults = controller_tick(&ctl, counts, still, still, still);
        CHECK((faults & (ROLN_FAULT_RANGE | ROLN_FAULT_STATUS)) != 0 && (ctl.seen & because) != 0);
        for (int i = 0; i < JOINTS; i++)
            CHECK(!(ctl.guard.tau[i] > 0) && !(ctl.guard.tau[i] < 0));
    }
}

/* An encoder slips while the arm stands: within 12 ticks the motors get the safe torque, and keep it, though the filter starts
   again at the wrong pose. Once the filter and the guard are zeroed, they move again. */
static void test_slip(int slip)
{
    static controller ctl;
    const roln_real still[JOINTS] = {0};
    int counts[JOINTS] = {0}, k, i;
    memset(&ctl, 0, sizeof ctl);
    for (k = 0; k < 30; k++)
        CHECK((controller_tick(&ctl, counts, still, still, still) & ~ROLN_CLIPPED) == 0);
    counts[1] = slip;
    for (k = 0; k < 60; k++) {
        const uint32_t faults = controller_tick(&ctl, counts, still, still, still);
        CHECK(k < 5 || (faults & ROLN_FAULT_STATUS));
        for (i = 0; k >= 12 && i < JOINTS; i++)
            CHECK((faults & ROLN_FAULT_EXPIRED) && !(ctl.guard.tau[i] > 0) && !(ctl.guard.tau[i] < 0));
    }
    CHECK(ctl.filter.f.starts == 2 && ctl.filter.f.outliers >= 6);
    memset(&ctl.filter, 0, sizeof ctl.filter), memset(&ctl.guard.g, 0, sizeof ctl.guard.g);
    CHECK((controller_tick(&ctl, counts, still, still, still) & ~ROLN_CLIPPED) == 0 && ROLN_ABS(ctl.guard.tau[1]) > 0);
}

/* From joint first on no count comes. noise.lost ticks are bridged, and the motors go on; limits.hold more ticks have the last
   torque, those behind them the safe one, also when counts come back. Once filter and guard.g are zeroed, the motors move again. */
static void test_lost(int first)
{
    static controller ctl;
    const roln_real still[JOINTS] = {0};
    const int all[JOINTS] = {0};
    int counts[JOINTS] = {0}, i, k;
    memset(&ctl, 0, sizeof ctl);
    for (i = first; i < JOINTS; i++)
        counts[i] = LOST;
    for (k = 0; k < 100; k++) { /* gaps that are bridged, and a tick between them */
        const int *const count = k < 30 || k % (noise.lost + 1) == 0 ? all : counts;
        CHECK((controller_tick(&ctl, count, still, still, still) & ~ROLN_CLIPPED) == 0 && ROLN_ABS(ctl.guard.tau[1]) > 0);
        CHECK(((ctl.seen & ROLN_FILTER_MISSING) != 0) == (count == counts));
    }
    CHECK((controller_tick(&ctl, all, still, still, still) & ~ROLN_CLIPPED) == 0);
    for (k = 0; k < 1000; k++) {
        const uint32_t faults = controller_tick(&ctl, k < 900 ? counts : all, still, still, still) & ~ROLN_CLIPPED;
        const int held = noise.lost + limits.hold;
        CHECK(k >= 900 || ((faults & ROLN_FAULT_STATUS) != 0) == (k >= noise.lost));
        CHECK(((faults & ROLN_FAULT_EXPIRED) != 0) == (k >= held));
        for (i = 0; i < JOINTS; i++)
            CHECK(k < held || (!(ctl.guard.tau[i] > 0) && !(ctl.guard.tau[i] < 0)));
        CHECK(k >= held || ROLN_ABS(ctl.guard.tau[1]) > 0);
    }
    memset(&ctl.filter, 0, sizeof ctl.filter), memset(&ctl.guard.g, 0, sizeof ctl.guard.g);
    CHECK((controller_tick(&ctl, all, still, still, still) & ~ROLN_CLIPPED) == 0 && ROLN_ABS(ctl.guard.tau[1]) > 0);
}

/* A joint comes in no tick as it is: lost in `lost` of six, in the others as an outlier. Neither ends the row of the other, so the
   motors get the safe torque after as many ticks as if it were lost in all. */
static void test_by_turns(int lost)
{
    static controller ctl;
    const roln_real still[JOINTS] = {0};
    int counts[JOINTS] = {0};
    memset(&ctl, 0, sizeof ctl);
    for (int k = 0; k < 30; k++)
        CHECK((controller_tick(&ctl, counts, still, still, still) & ~ROLN_CLIPPED) == 0);
    for (int k = 0; k < 300; k++) {
        counts[1] = k % 6 < lost ? LOST : 200;
        const uint32_t faults = controller_tick(&ctl, counts, still, still, still);
        CHECK(((faults & ROLN_FAULT_EXPIRED) != 0) == (k >= noise.lost + limits.hold));
    }
}

/* Accelerations anywhere, then half a second of motion by the same scheme and steps. */
void test_arm(void)
{
    char error[500];
    mjModel *m = mj_loadXML("tests/mujoco/plants/arm.xml", NULL, error, sizeof error);
    mjData *d;
    uint64_t seed = 1;
    test_no_start(100 * STEPS, ROLN_FAULT_RANGE);
    test_no_start(LOST, ROLN_FILTER_NONE);
    test_slip(200), test_slip(-33);
    test_lost(0), test_lost(1), test_lost(JOINTS - 1);
    test_by_turns(1), test_by_turns(3), test_by_turns(5);
    CHECK_NEAR(limits.novelty, arm_limits.novelty, 0.5); /* rounded */
    test_holes();
    if (!CHECK(m != NULL)) return;
    d = mj_makeData(m);
    for (int k = 0; k < 20; k++) {
        motion s;
        double qdd[JOINTS], tau[JOINTS];
        mj_resetData(m, d);
        for (int i = 0; i < JOINTS; i++) {
            d->qpos[i] = s.q[i] = 6 * (double)roln_uniform(&seed) - 3;
            d->qvel[i] = s.qd[i] = 6 * (double)roln_uniform(&seed) - 3;
            d->ctrl[i] = tau[i] = m->actuator_ctrlrange[2 * i + 1] * (2 * (double)roln_uniform(&seed) - 1);
        }
        mj_forward(m, d);
        acceleration(&s, tau, qdd);
        for (int i = 0; i < JOINTS; i++)
            CHECK_NEAR(d->qacc[i], qdd[i], 1e-9 * (1 + fabs(qdd[i])));
        for (int t = 0; t < 500; t++) {
            mj_step(m, d);
            advance(&s, tau, m->opt.timestep);
        }
        for (int i = 0; i < JOINTS; i++)
            CHECK_NEAR(d->qpos[i], s.q[i], 1e-6 * (1 + fabs(s.q[i])));
    }
    mj_deleteData(d);
    mj_deleteModel(m);
}
