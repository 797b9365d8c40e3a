/* SPDX-License-Identifier: MIT */
/* Dry friction of a machine in MuJoCo, identified by the trainer's method: two rods on joints that turn all round, with
   frictionloss and viscous damping, driven by sines. frictionloss is a constraint there, rigid nearly; learned is
   c tanh(qd / v), so that c is the level to be found. */
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdlib.h>
#include <string.h>

#define ROLN_NAME rods
#define ROLN_AE 2
#define ROLN_MLP 16, 16
#define ROLN_ANGLES 1, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_GN_ROWS 800 /* ROWS */
#include "roln.h"
#include "../unit/check.h"

void test_friction(void);

static const char xml[] =
    "<mujoco><option timestep='0.001' gravity='0 0 -9.81'/><worldbody><body>"
    "<joint type='hinge' axis='0 1 0' frictionloss='0.6' damping='0.1'/>"
    "<geom type='capsule' fromto='0 0 0 0 0 -0.5' size='0.02' mass='1' contype='0' conaffinity='0'/>"
    "<body pos='0 0 -0.5'><joint type='hinge' axis='0 1 0' frictionloss='0.25' damping='0.05'/>"
    "<geom type='capsule' fromto='0 0 0 0 0 -0.4' size='0.02' mass='0.5' contype='0' conaffinity='0'/>"
    "</body></body></worldbody></mujoco>";
static const double level[2] = {0.6, 0.25}, viscous[2] = {0.1, 0.05};

enum { RUNS = 40, LENGTH = 400, SAMPLES = RUNS * LENGTH, EVERY = 5, ROWS = 800, STEPS = 250, LAST = 8 };
static roln_real q[SAMPLES * 2], qd[SAMPLES * 2], qdd[SAMPLES * 2], tau[SAMPLES * 2];

static mjModel *load(void)
{
    char error[500] = "";
    mjVFS *vfs = malloc(sizeof *vfs);
    mjModel *m;
    mj_defaultVFS(vfs);
    mj_makeEmptyFileVFS(vfs, "rods.xml", (int)strlen(xml));
    memcpy(vfs->filedata[0], xml, strlen(xml));
    m = mj_loadXML("rods.xml", vfs, error, sizeof error);
    mj_deleteVFS(vfs);
    free(vfs);
    return m;
}

/* Runs of two seconds under two sines in each joint, from any angles, of which the recording keeps no turns. */
static void record(const mjModel *m, uint64_t *seed)
{
    mjData *d = mj_makeData(m);
    for (int run = 0; run < RUNS; run++) {
        double size[4], rate[4], phase[4];
        mj_resetData(m, d);
        for (int i = 0; i < 4; i++) {
            size[i] = (i < 2 ? 3 : 1) * (double)roln_uniform(seed), rate[i] = 1 + 14 * (double)roln_uniform(seed);
            phase[i] = 6.3 * (double)roln_uniform(seed);
        }
        for (int i = 0; i < 2; i++)
            d->qpos[i] = 6.3 * (double)roln_uniform(seed), d->qvel[i] = 6 * (2 * (double)roln_uniform(seed) - 1);
        for (int k = 0; k < LENGTH * EVERY; k++) {
            for (int i = 0; i < 2; i++)
                d->qfrc_applied[i] = size[2 * i] * sin(rate[2 * i] * d->time + phase[2 * i]) +
                                     size[2 * i + 1] * sin(rate[2 * i + 1] * d->time + phase[2 * i + 1]);
            mj_forward(m, d);
            for (int i = 0; i < 2 && k % EVERY == 0; i++) {
                const int at = (run * LENGTH + k / EVERY) * 2 + i;
                q[at] = roln_wrap((roln_real)d->qpos[i]), qd[at] = (roln_real)d->qvel[i];
                qdd[at] = (roln_real)d->qacc[i], tau[at] = (roln_real)d->qfrc_applied[i];
            }
            mj_step(m, d);
        }
    }
    mj_deleteData(d);
}

/* Recursive Gauss-Newton on the accelerations of random samples, and on inverse dynamics, as torques work; the mean of the last
   steps. */
static void learn(rods_params *p, uint64_t *seed)
{
    static const roln_loss weights = {.qdd_pred = 1, .force = 1};
    static const roln_newton_opt opt = ROLN_NEWTON_OPT;
    static rods_residuals rows;
    static rods_newton newton = {.state = ROLN_NEWTON_START};
    static rods_train work;
    static rods_start start;
    static roln_real sums[ROLN_SYM_WORK], mean[rods_theta_size];
    int first[ROWS];
    roln_real qbar[2];
    roln_batch b = {.stride = 1, .start = first, .q = q, .qd = qd, .qdd = qdd, .tau = tau};
    CHECK(rods_init_pod(p, SAMPLES, q, qd, qbar, seed, &start.init_pod) == ROLN_OK);
    for (int t = 1; t <= STEPS; t++) {
        for (int i = 0; i < ROWS; i++)
            first[i] = roln_randint(SAMPLES, seed);
        rows.seed = roln_rand(seed), b.count = ROWS;
        CHECK(rods_rows(p, &weights, &b, 1, 0, 0, &rows, &work.rows) == ROLN_OK);
        CHECK(rods_newton_rows(p, &opt, ROWS, &rows, &newton) == ROLN_OK);
        rods_newton_normal_equations(&opt, ROWS, 0, rods_newton_side, &rows, &newton, sums);
        b.count = ROWS / 4;
        for (int taken = 0, tries = 0; !taken && tries < 10; tries++) {
            CHECK(rods_newton_step(p, &opt, ROWS, &rows, &newton) == ROLN_OK);
            rods_rows(&newton.next, &weights, &b, 1, 0, 1, &rows, &work.rows);
            taken = rods_newton_accept(p, ROWS, ROWS / 4, &rows, &newton);
        }
        for (int i = 0; i < rods_theta_size && t > STEPS - LAST; i++)
            mean[i] += p->theta[i] / LAST;
    }
    memcpy(p->theta, mean, sizeof mean);
}

void test_friction(void)
{
    static rods_params p;
    static rods_work work;
    uint64_t seed = 7;
    mjModel *m = load();
    roln_real c[2], v[2];
    if (!CHECK(m != NULL)) return;
    record(m, &seed);
    mj_deleteModel(m);
    learn(&p, &seed);
    CHECK(rods_friction_of(&p, c, v) == ROLN_OK);
    for (int j = 0; j < 2; j++) {
        rods_equation e[2];
        CHECK_NEAR(c[j], level[j], 0.1 * level[j]);
        CHECK_BELOW(v[j], 0.5);
        for (int k = 0; k < 2; k++) { /* what the fast joint loses beyond that is viscous */
            rods_latent s = {{ROLN_C(0.5), ROLN_C(1.5)}, {0, 0}};
            s.zd[j] = 2 + 4 * (roln_real)k;
            CHECK(rods_dynamics(&p, &s, e + k, &work.dynamics) == ROLN_OK);
        }
        CHECK_NEAR((e[1].d[j] - e[0].d[j]) / 4, viscous[j], 0.3 * viscous[j]);
        printf("friction of joint %d: c %.3f of %.3f Nm, v %.3f rad/s, viscous %.3f of %.3f Nm s\n", j + 1, (double)c[j], level[j],
               (double)v[j], (double)(e[1].d[j] - e[0].d[j]) / 4, viscous[j]);
    }
}
