/* SPDX-License-Identifier: MIT */
/* rope_plant - see rope_plant.h. */
#include <math.h>
#include <stdio.h>

#include "rope_plant.h"

mjModel *plant_load(void)
{
    char error[500];
    mjModel *m = mj_loadXML("tests/mujoco/plants/rope.xml", NULL, error, sizeof error);
    if (!m) fprintf(stderr, "rope: %s\n", error);
    return m;
}

void plant_start(const mjModel *m, mjData *d, struct plant_run *r)
{
    mj_resetData(m, d);
    d->qpos[0] = ROPE_TARGET - ROPE_MOVE;
    r->ticks = 0;
}

void plant_tip(const mjModel *m, const mjData *d, double y[4])
{
    double x = d->qpos[0] - ROPE_TARGET, z = 0, xd = d->qvel[0], zd = 0, a = 0, ad = 0;
    for (int i = 1; i < m->nv; i++) {
        a += d->qpos[i], ad += d->qvel[i]; /* of a link against the vertical */
        x -= 0.1 * sin(a), z += 0.1 * (1 - cos(a)), xd -= 0.1 * cos(a) * ad, zd += 0.1 * sin(a) * ad;
    }
    y[0] = x, y[1] = z, y[2] = xd, y[3] = zd;
}

static void look(const mjModel *m, const mjData *d, struct plant_run *r)
{
    double y[4];
    plant_tip(m, d, y);
    for (int i = 0; i < 2; i++)
        r->tip[r->ticks][i] = y[i], r->speed[r->ticks][i] = y[2 + i];
}

void plant_tick(const mjModel *m, mjData *d, const double u[ROPE_MOTORS], struct plant_run *r)
{
    for (int j = 0; j < ROPE_MOTORS; j++)
        d->ctrl[j] = r->u[r->ticks][j] = fmin(fmax(u[j], m->actuator_ctrlrange[2 * j]), m->actuator_ctrlrange[2 * j + 1]);
    if (r->ticks == 0) look(m, d, r);
    mj_step(m, d);
    r->ticks++;
    look(m, d, r);
}

double plant_settled(const struct plant_run *r)
{
    int k = r->ticks;
    while (k >= 0 && hypot(r->tip[k][0], r->tip[k][1]) <= ROPE_NEAR * ROPE_MOVE &&
           hypot(r->speed[k][0], r->speed[k][1]) <= ROPE_SLOW * ROPE_MOVE)
        k--;
    return ROPE_TICK * (k + 1 < r->ticks ? k + 1 : r->ticks);
}

double plant_swing(const struct plant_run *r, double seconds)
{
    double most = 0;
    for (int k = (int)(seconds / ROPE_TICK + 0.5); k <= r->ticks; k++)
        most = fmax(most, hypot(r->tip[k][0], r->tip[k][1]));
    return most;
}

double plant_at_limit(const mjModel *m, const struct plant_run *r, double seconds)
{
    const int ticks = (int)(seconds / ROPE_TICK + 0.5);
    int at = 0;
    for (int k = 0; k < ticks; k++)
        at += fabs(r->u[k][0]) > 0.999 * m->actuator_ctrlrange[1] || fabs(r->u[k][1]) > 0.999 * m->actuator_ctrlrange[3];
    return ticks ? (double)at / ticks : 0;
}
