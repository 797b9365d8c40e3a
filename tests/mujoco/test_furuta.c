/* SPDX-License-Identifier: MIT */
/* The Furuta pendulum of examples/ in MuJoCo: its plant in plain C moves as MuJoCo's does, and the controller, learned from the
   plant, swings MuJoCo's up and holds it. Its guard refuses what was never seen. */
#include <mujoco/mujoco.h>
#include <stdlib.h>

#include "furuta_plant.h"
#include "furuta_tick.h"
#include "../unit/check.h"
#define M(x) furuta_##x
#include "holes.h"

void test_furuta(void);

static mjModel *m;
static mjData *d;

static void place(const motion *s)
{
    mj_resetData(m, d);
    for (int i = 0; i < 2; i++)
        d->qpos[i] = s->q[i], d->qvel[i] = s->qd[i];
}

/* Accelerations anywhere, then a second of motion by the same scheme and steps. */
static void test_plant(void)
{
    uint64_t seed = 1;
    for (int k = 0; k < 100; k++) {
        motion s;
        double qdd[2];
        const double torque = 0.04 * (2 * (double)roln_uniform(&seed) - 1);
        for (int i = 0; i < 2; i++) {
            s.q[i] = 20 * (double)roln_uniform(&seed) - 10;
            s.qd[i] = 40 * (double)roln_uniform(&seed) - 20;
        }
        place(&s);
        d->ctrl[0] = torque;
        mj_forward(m, d);
        acceleration(&s, torque, qdd);
        for (int i = 0; i < 2; i++)
            CHECK_NEAR(d->qacc[i], qdd[i], 1e-6 * (1 + fabs(qdd[i])));
        for (int t = 0; t < 2000; t++) {
            mj_step(m, d);
            advance(&s, torque, m->opt.timestep);
        }
        for (int i = 0; i < 2; i++)
            CHECK_NEAR(d->qpos[i], s.q[i], 1e-6 * (1 + fabs(s.q[i])));
    }
}

/* The controller of furuta.c around MuJoCo's machine, from rest at an angle: upright after 5 s, and not down again. */
static void test_swing_up(double angle)
{
    static controller ctl;
    const double step = 6.283185307179586 / STEPS;
    const motion s = {{0, angle}, {0, 0}};
    double most = 0;
    CHECK(controller_start(&ctl) == ROLN_OK);
    place(&s);
    for (int k = 0; k < 8000; k++) {
        int count[2];
        for (int i = 0; i < 2; i++)
            count[i] = (int)floor(remainder(d->qpos[i], 6.283185307179586) / step + 0.5);
        CHECK((controller_tick(&ctl, count) & ~(uint32_t)ROLN_CLIPPED) == 0);
        d->ctrl[0] = (double)ctl.guard.tau[0];
        mj_step(m, d), mj_step(m, d);
        if (k >= 5000) most = fmax(most, fabs(remainder(d->qpos[1] - 3.141592653589793, 6.283185307179586)));
    }
    CHECK_BELOW(most, 0.02);
}

void test_furuta(void)
{
    char error[500];
    m = mj_loadXML("tests/mujoco/plants/furuta.xml", NULL, error, sizeof error);
    if (!CHECK(m != NULL)) return;
    d = mj_makeData(m);
    test_plant();
    test_holes();
    CHECK_NEAR(limits.novelty, furuta_limits.novelty, 0.5); /* rounded */
    for (int k = 0; k < 5; k++)
        test_swing_up(0.01 + 0.7 * k);
    mj_deleteData(d);
    mj_deleteModel(m);
}
