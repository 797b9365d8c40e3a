/* SPDX-License-Identifier: MIT */
/* rope_best - the shortest time in which MuJoCo's rope can be brought to rest, see rope_plant.h. Compiled in double.

   For a horizon of K steps of ROPE_EVERY ticks: force and torque, held for a step each, are found by sequential quadratic
   programming: central differences of mj_step, the excess of tip and velocity over what counts as at rest from step K on as least
   squares, limits by roln_ocp_solve, a line search along its feedback on MuJoCo itself. K is halved down to one step. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "roln.h"
#include "rope_plant.h"

enum { N = ROPE_JOINTS, S = 2 * N, M = ROPE_MOTORS, REST = ROPE_REST / ROPE_EVERY, LEAST = 20, MOST = 120, STEPS = MOST + REST,
       ROUNDS = 40 };
#define EDGE 0.9 /* of what counts as at rest, where cost begins */
#define WEIGHT 1.0

static struct {
    const mjModel *m;
    mjData *d;
    int K, steps;
    double r; /* weight of u */
    double s[STEPS + 1][S], s1[STEPS + 1][S], u[STEPS][M], u1[STEPS][M], du[STEPS * M], x[(STEPS + 1) * S], Kb[STEPS * M * S];
    double A[STEPS][S][S], B[STEPS][S][M], Q[STEPS][S][S], q[STEPS][S], work[ROLN_OCP_WORK(S, M, STEPS, 0)];
} b;

/* to [S]: a step from s under u, in parts of the limits. */
static void step(const double *s, const double *u, double *to)
{
    memcpy(b.d->qpos, s, N * sizeof *s), memcpy(b.d->qvel, s + N, N * sizeof *s);
    for (int j = 0; j < M; j++)
        b.d->ctrl[j] = u[j] * b.m->actuator_ctrlrange[2 * j + 1];
    for (int k = 0; k < ROPE_EVERY; k++)
        mj_step(b.m, b.d);
    memcpy(to, b.d->qpos, N * sizeof *s), memcpy(to + N, b.d->qvel, N * sizeof *s);
}

static void derivatives(int k)
{
    const double h = 1e-5;
    for (int i = 0; i < S + M; i++) {
        double x[S + M], plus[S], minus[S];
        memcpy(x, b.s[k], sizeof b.s[k]), memcpy(x + S, b.u[k], sizeof b.u[k]);
        x[i] += h, step(x, x + S, plus);
        x[i] -= 2 * h, step(x, x + S, minus);
        for (int j = 0; j < S; j++)
            *(i < S ? &b.A[k][j][i] : &b.B[k][j][i - S]) = (plus[j] - minus[j]) / (2 * h);
    }
}

/* Cost of the state behind step k; with Q its gradient and, of Gauss-Newton, its Hessian. */
static double cost(int k, const double *s, double *Q, double *q)
{
    double y[4], sum = 0, J[4][S] = {{0}};
    if (Q) memset(Q, 0, S * S * sizeof *Q), memset(q, 0, S * sizeof *q);
    if (k + 1 < b.K) return 0;
    memcpy(b.d->qpos, s, N * sizeof *s), memcpy(b.d->qvel, s + N, N * sizeof *s);
    plant_tip(b.m, b.d, y);
    for (int i = 0; i < S && Q; i++) {
        double plus[4], minus[4], *x = i < N ? &b.d->qpos[i] : &b.d->qvel[i - N];
        *x += 1e-5, plant_tip(b.m, b.d, plus);
        *x -= 2e-5, plant_tip(b.m, b.d, minus);
        *x += 1e-5;
        for (int j = 0; j < 4; j++)
            J[j][i] = (plus[j] - minus[j]) / 2e-5;
    }
    for (int p = 0; p < 2; p++) { /* tip, its velocity: how far outside of a circle */
        const double *const v = y + 2 * p, size = hypot(v[0], v[1]), edge = ROPE_MOVE * (p ? ROPE_SLOW : ROPE_NEAR);
        const double e = (size - EDGE * edge) / edge, along = (1 - e * edge / size) / (edge * edge), all = e / (size * edge);
        if (e <= 0) continue;
        sum += WEIGHT / 2 * e * e;
        for (int i = 0; i < S && Q; i++) {
            const double g = (v[0] * J[2 * p][i] + v[1] * J[2 * p + 1][i]) / size;
            q[i] += WEIGHT * e / edge * g;
            for (int j = 0; j < S; j++)
                Q[i * S + j] += WEIGHT * (along * g * (v[0] * J[2 * p][j] + v[1] * J[2 * p + 1][j]) / size +
                                          all * (J[2 * p][i] * J[2 * p][j] + J[2 * p + 1][i] * J[2 * p + 1][j]));
        }
    }
    return sum;
}

/* Rolls a part of the step out to s1 under u1; its cost. */
static double roll(double part)
{
    double sum = 0;
    memcpy(b.s1[0], b.s[0], sizeof b.s[0]);
    for (int k = 0; k < b.steps; k++) {
        for (int j = 0; j < M; j++) {
            double to = b.u[k][j] + part * (b.du[k * M + j] - b.u[k][j]);
            for (int i = 0; i < S && part > 0; i++)
                to -= b.Kb[(k * M + j) * S + i] * (b.s1[k][i] - b.s[k][i] - part * b.x[k * S + i]);
            b.u1[k][j] = fmin(1, fmax(-1, to));
            sum += b.r / 2 * b.u1[k][j] * b.u1[k][j];
        }
        step(b.s1[k], b.u1[k], b.s1[k + 1]);
        sum += cost(k, b.s1[k + 1], NULL, NULL);
    }
    return sum;
}

/* The run under b.u, tick by tick: does it settle in K steps? */
static int settles(struct plant_run *r)
{
    plant_start(b.m, b.d, r);
    for (int k = 0; k < b.steps * ROPE_EVERY; k++) {
        double u[M];
        for (int j = 0; j < M; j++)
            u[j] = b.u[k / ROPE_EVERY][j] * b.m->actuator_ctrlrange[2 * j + 1];
        plant_tick(b.m, b.d, u, r);
    }
    return plant_settled(r) <= ROPE_TICK * ROPE_EVERY * b.K + 1e-9;
}

static int solve(int K, struct plant_run *r)
{
    static const double ref[M] = {0, 0};
    double before, after = 0;
    b.K = K, b.steps = K + REST, b.r = 100;
    memset(b.s[0], 0, sizeof b.s[0]);
    b.s[0][0] = ROPE_TARGET - ROPE_MOVE;
    before = roll(0);
    memcpy(b.s, b.s1, sizeof b.s), memcpy(b.u, b.u1, sizeof b.u);
    for (int round = 0; round < ROUNDS; round++) {
        const double weight[M] = {b.r, b.r};
        const roln_ocp o = {.n = S, .m = M, .steps = b.steps, .A = b.A[0][0], .B = b.B[0][0], .Q = b.Q[0][0], .q = b.q[0],
                            .r = weight, .ref = ref, .at = b.u[0]};
        double part = 1;
        for (int k = 0; k < b.steps; k++) {
            derivatives(k);
            cost(k, b.s[k + 1], b.Q[k][0], b.q[k]);
        }
        if (roln_ocp_solve(&o, 20, b.du, b.x, b.Kb, NULL, b.work) != ROLN_OK) return 0;
        while (part > 0.01 && !((after = roll(part)) < before))
            part /= 2;
        if (part > 0.01) memcpy(b.s, b.s1, sizeof b.s), memcpy(b.u, b.u1, sizeof b.u);
        if (settles(r)) return 1;
        if (part <= 0.01 || before - after < 1e-2 * before) {
            if (b.r < 1e-6) break;
            b.r /= 10;
        }
        before = roll(0);
    }
    return settles(r);
}

int plant_best(const mjModel *m, struct plant_run *r, int say)
{
    static struct plant_run tried;
    static double good[STEPS][M];
    int low = LEAST, high = MOST, found = 0;
    b.m = m, b.d = mj_makeData(m);
    memset(b.u, 0, sizeof b.u);
    while (high > low) {
        const int K = found || high < MOST ? (low + high) / 2 : MOST, good_one = solve(K, &tried);
        if (say) printf("  %.2f s: %s\n", K * ROPE_EVERY * ROPE_TICK, good_one ? "settles" : "does not"), fflush(stdout);
        if (good_one) found = high = K, *r = tried, memcpy(good, b.u, sizeof good);
        else if (K == MOST) break;
        else low = K + 1;
        memcpy(b.u, good, sizeof good);
    }
    mj_deleteData(b.d);
    return found;
}
