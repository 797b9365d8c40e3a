/* SPDX-License-Identifier: MIT */
/* The arm of examples/ in MuJoCo with a payload at its tip that no recording had: its filter estimates a load (ROLN_LOAD), with
   which the same tick, weights, gains and encoders make do, or without. */
#include <mujoco/mujoco.h>
#include <stdlib.h>

#define ROLN_LOAD 1 /* of the arm, whose weights do not depend on it */
#include "arm_tick.h"
#include "../unit/check.h"

void test_load(void);

enum { N = arm_N, POSES = 6, MOVE = 1500, REST = 1500, LAST = 500 };

/* kg at the tip, as a point. */
static void carry(mjModel *m, mjData *d, double payload)
{
    const int b = m->nbody - 1;
    const double tip[3] = {0.1, 0, 0}, mass = m->body_mass[b], sum = mass + payload;
    double r[3];
    for (int k = 0; k < 3; k++) {
        r[k] = tip[k] - m->body_ipos[3 * b + k];
        m->body_ipos[3 * b + k] += payload / sum * r[k];
    }
    for (int k = 0; k < 3; k++)
        m->body_inertia[3 * b + k] += mass * payload / sum * (r[(k + 1) % 3] * r[(k + 1) % 3] + r[(k + 2) % 3] * r[(k + 2) % 3]);
    m->body_mass[b] = sum;
    mj_setConst(m, d);
}

/* What the joints are off at rest, over poses, mrad: the root of the mean square, and the largest; PD+ works against the load or,
   not counted, does not. */
static double error_of(double payload, int counted, double *worst)
{
    static const double middle[N] = {0, 0, -0.75, 0, 0, 0}, reach[N] = {1, 0.6, 0.6, 1, 0.8, 1};
    static controller c;
    char error[500];
    mjModel *m = mj_loadXML("tests/mujoco/plants/arm.xml", NULL, error, sizeof error);
    mjData *d;
    double sum = 0, from[N], to[N];
    uint64_t seed = 5;
    *worst = 0;
    if (!CHECK(m != NULL)) return 0;
    d = mj_makeData(m);
    carry(m, d, payload);
    memset(&c, 0, sizeof c);
    c.target.load = counted ? c.filter.load : NULL;
    memcpy(d->qpos, middle, sizeof middle), memcpy(to, middle, sizeof to);
    for (int pose = 0; pose < POSES; pose++) {
        double mean[N] = {0};
        memcpy(from, to, sizeof from);
        for (int i = 0; i < N; i++)
            to[i] = middle[i] + reach[i] * (2 * (double)roln_uniform(&seed) - 1);
        for (int t = 0; t < MOVE + REST; t++) {
            const double T = MOVE * (double)TICK, u = t < MOVE ? (double)t / MOVE : 1;
            roln_real q[N], qd[N], qdd[N];
            int count[N];
            for (int i = 0; i < N; i++) {
                const double far = to[i] - from[i];
                q[i] = (roln_real)(from[i] + far * u * u * u * (10 - 15 * u + 6 * u * u));
                qd[i] = (roln_real)(far / T * 30 * u * u * (1 - u) * (1 - u));
                qdd[i] = (roln_real)(far / (T * T) * 60 * u * (1 - u) * (1 - 2 * u));
            }
            for (int i = 0; i < N; i++)
                count[i] = (int)floor(d->qpos[i] / (double)TURN * STEPS + 0.5);
            CHECK((controller_tick(&c, count, q, qd, qdd) & ~(uint32_t)ROLN_CLIPPED) == 0 &&
                  (c.seen & ~(uint32_t)ROLN_FILTER_START) == 0 && c.filter.f.starts == 1);
            for (int i = 0; i < N; i++) {
                if (t >= MOVE + REST - LAST) mean[i] += (d->qpos[i] - to[i]) / LAST;
                d->ctrl[i] = (double)c.guard.tau[i];
            }
            mj_step(m, d);
        }
        for (int i = 0; i < N; i++)
            sum += mean[i] * mean[i] / (N * POSES), *worst = fmax(*worst, fabs(mean[i]));
    }
    mj_deleteData(d);
    mj_deleteModel(m);
    *worst *= 1e3;
    return 1e3 * sqrt(sum);
}

void test_load(void)
{
    printf("RAM of the arm's filter with a load: %d bytes, and scratch %d\n", (int)sizeof(arm_filter),
           (int)sizeof(arm_filter_tick_work));
    printf("the arm at rest, rms and largest error of its joints, mrad:   without the load      with it\n");
    for (int i = 0; i < 3; i++) {
        static const double payload[3] = {0, 1, 2};
        double worst[2], rms[2];
        for (int counted = 0; counted < 2; counted++)
            rms[counted] = error_of(payload[i], counted, worst + counted);
        printf("    payload %.0f kg %43s %8.3f %8.3f %10.4f %8.4f\n", payload[i], "", rms[0], worst[0], rms[1], worst[1]);
        CHECK_BELOW(rms[1], i > 0 ? rms[0] / 20 : rms[0] / 3); /* encoders step by 1.5 mrad */
    }
}
