/* SPDX-License-Identifier: MIT */
/* mpc.c - predictive control of the learned Furuta pendulum: swung up, caught and held by plans within the torque limit.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/mpc.c -o mpc -lm
   ./mpc [picture.svg]

   Machine, encoders, torque limit and model are those of furuta.c, whose controller swings up by an energy and catches by feedback
   about upright. Here the goal alone is told: 50 times a second furuta_plan_next finds the torques of the next .6 s that bring the
   pendulum upright and the arm to 0 at the least cost; in between, at 1 kHz, furuta_plan_follow corrects them by the encoders.
   Velocities are those of the Kalman filter on the model, furuta_filter_tick. The simulation waits for a plan, a machine does not:
   see docs/control.md. The energy law of furuta.c, whose filters know single joints only, is run beside it.

   1 what runs in the controller     2 closed loops     3 picture */

#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "furuta_plant.h"
#include "furuta_tick.h"

/* ---- 1 what runs in the controller ------------------------------------------------------------ */

/* As bad as each other: 1 rad of the arm, .3 rad of the pendulum, 5 rad/s, 3 rad/s, .03 Nm. */
static const roln_real q_ref[2] = {0, PI}, q_weight[2] = {1, 10};
static const roln_real qd_ref[2] = {0, 0}, qd_weight[2] = {ROLN_C(0.04), ROLN_C(0.1)}, u_weight[1] = {1000};
static const roln_term terms[2] = {{.of = ROLN_OF_Q, .weight = q_weight, .ref = q_ref},
                                   {.of = ROLN_OF_QD, .weight = qd_weight, .ref = qd_ref}};
enum { EVERY = 20 }; /* ticks from plan to plan */
static const roln_goal goal = {.dt = EVERY * TICK, .terms = 2, .term = terms, .u = u_weight, .limits = &limits};

/* Encoders that round, and torques that the model misses. */
static const roln_real missed[2] = {ROLN_C(0.001), ROLN_C(0.0001)};
static const roln_noise noise = {.dt = TICK, .q = 2 * PI / STEPS / ROLN_C(3.4641), .gate = 8, .lost = 5, .tau_each = missed};

typedef struct {
    furuta_filter filter; /* filter.s: z, zd, which here are q, qd */
    furuta_guard guard;   /* guard.tau[0], Nm: to the motor */
    furuta_plan plan;
    int age;              /* ticks since the last call of furuta_plan_next */
    furuta_work work;
    furuta_filter_tick_work filterwork;
    furuta_plan_next_work planwork;
} planner;

/* One tick, 1 kHz. If no plan is better, the last one goes on for up to 30 steps; without any the guard gets no torque. */
static uint32_t planner_tick(planner *p, const int count[2])
{
    const roln_real y[2] = {(roln_real)count[0] * (2 * PI / STEPS), (roln_real)count[1] * (2 * PI / STEPS)};
    const roln_real tau[2] = {p->guard.tau[0], 0};
    const uint32_t bits = furuta_filter_tick(&furuta_weights, &noise, y, tau, &p->filter, &p->filterwork);
    /* one that starts again may have believed an encoder that slipped */
    const int known = !(bits & (ROLN_FILTER_NONE | ROLN_FAULT_STATUS)) && p->filter.f.starts < 2;
    const furuta_latent *s = known ? &p->filter.s : NULL;
    furuta_state x;
    roln_real u = 0;
    int good = 0;
    memcpy(x.q, p->filter.s.z, sizeof x.q), memcpy(x.qd, p->filter.s.zd, sizeof x.qd);
    p->age++;
    if (p->age > EVERY) p->plan.plan.valid = 0; /* without an estimate a call was left out */
    if (s && p->age >= EVERY) {
        (void)furuta_plan_next(&furuta_weights, &goal, s, &p->plan, &p->planwork);
        p->age = 0;
    }
    if (s) good = furuta_plan_follow(&furuta_weights, &goal, &p->plan, TICK * (roln_real)p->age, s, &u) == ROLN_OK;
    return bits | furuta_guard_tick(&furuta_weights, &limits, &x, s, good ? &u : NULL, &p->guard, &p->work.guard_tick);
}

/* ---- 2 closed loops --------------------------------------------------------------------------- */

#define TURN 6.283185307179586
enum { POSES = 20, TICKS = 3000, PLANS = POSES * TICKS / EVERY };
static planner mpc;
static controller law;
static struct { double angle[TICKS], torque[TICKS]; furuta_plan plan[TICKS / EVERY]; } shown; /* of the last pose */
static double ms[PLANS];        /* of ticks with a plan */
static int plans, full, beyond; /* those, the plans with a torque at the limit, the torques beyond it */

static void look(const motion *s, int tick, double seconds)
{
    int at_limit = 0;
    beyond += !(fabs((double)mpc.guard.tau[0]) <= (double)TORQUE);
    shown.angle[tick] = s->q[1], shown.torque[tick] = (double)mpc.guard.tau[0];
    if (mpc.age > 0) return;
    for (int k = 0; k < furuta_steps; k++) {
        const double part = fabs((double)(mpc.plan.u[k] / TORQUE));
        beyond += !(part <= 1), at_limit |= part > 0.99;
    }
    shown.plan[tick / EVERY] = mpc.plan;
    full += at_limit, ms[plans++] = 1e3 * seconds;
}

/* 3 s from rest at q, by plans or by the law of furuta.c. When was it upright for good? -1: it was not. */
static double up_since(const double q[2], int by_plans)
{
    motion s = {{q[0], q[1]}, {0, 0}};
    double tilt = 0, since = 0;
    memset(&mpc, 0, sizeof mpc), mpc.age = EVERY;
    if (controller_start(&law) != ROLN_OK) exit(1);
    for (int t = 0; t < TICKS; t++) {
        int count[2];
        const clock_t start = clock();
        for (int i = 0; i < 2; i++)
            count[i] = (int)floor(s.q[i] / TURN * STEPS + 0.5);
        (void)(by_plans ? planner_tick(&mpc, count) : controller_tick(&law, count));
        if (by_plans) look(&s, t, (double)(clock() - start) / CLOCKS_PER_SEC);
        for (int i = 0; i < 2; i++)
            advance(&s, (double)(by_plans ? mpc.guard.tau[0] : law.guard.tau[0]), (double)TICK / 2);
        tilt = fabs(remainder(s.q[1] - TURN / 2, TURN));
        if (tilt > 0.3) since = (t + 1) * (double)TICK;
    }
    return tilt < 0.05 ? since : -1;
}

static int larger(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* ---- 3 picture -------------------------------------------------------------------------------- */

enum { SHOWN = 1200 }; /* ticks, from 60 to 876 of the width */
typedef struct { double top, height, low, high, tick; } axes;

static double height(const axes *a, double y)
{
    return a->top + a->height * (a->high - y) / (a->high - a->low);
}

static void put(FILE *f, const axes *a, char how, double t, double y)
{
    fprintf(f, "%c%.1f %.1f", how, 60 + 816 * t / (SHOWN * (double)TICK), height(a, y));
}

static void draw_axes(FILE *f, const axes *a, const char *title)
{
    fprintf(f, "<text x='60' y='%g' font-weight='bold'>%s</text>\n", a->top - 10, title);
    for (double y = a->low; y <= a->high + 1e-9; y += a->tick)
        fprintf(f, "<text x='54' y='%.1f' text-anchor='end'>%g</text>\n", height(a, y) + 4, fabs(y) < 1e-9 ? 0 : y);
    for (int i = 0; i <= SHOWN; i += 200)
        fprintf(f, "<text x='%d' y='%g' text-anchor='middle'>%g%s</text>\n", 60 + 816 * i / SHOWN, a->top + a->height + 18,
                i * (double)TICK, i == SHOWN ? " s" : "");
    fprintf(f, "<path d='M60 %gv%gh816' fill='none' stroke='#444'/>\n", a->top, a->height);
}

static void draw_course(FILE *f, const axes *a, const double *y, double factor)
{
    fprintf(f, "<path fill='none' stroke='#9ecae1' stroke-width='4' d='");
    for (int t = 0; t < SHOWN; t += 2)
        put(f, a, t ? 'L' : 'M', t * (double)TICK, factor * y[t]);
    fprintf(f, "'/>\n");
}

/* Angle and torque as they were, and as the plan of a moment had them. */
static int draw(const char *path)
{
    static const int moment[2] = {100, 300};
    static const char *const colour[2] = {"#e6550d", "#31a354"};
    const double side_up = shown.angle[TICKS - 1] < 0 ? -1 : 1; /* drawn upwards, to whichever side it went */
    const axes angle = {64, 200, -2, 4, 2}, torque = {330, 130, -50, 50, 25};
    FILE *f = fopen(path, "w");
    if (!f) return perror(path), 1;
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='494' viewBox='0 0 900 494' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='900' height='494' fill='#fff'/>\n<text x='24' y='28' "
               "font-size='16'>A Furuta pendulum is swung up: as it moved, and as the plans at %g and %g s had it</text>\n",
            moment[0] * (double)TICK, moment[1] * (double)TICK);
    draw_axes(f, &angle, "pendulum, rad (upright: 3.14)");
    draw_axes(f, &torque, "torque, mNm, and its limits");
    for (int side = -1; side <= 1; side += 2) {
        fprintf(f, "<path stroke='#444' stroke-dasharray='2 3' d='");
        put(f, &torque, 'M', 0, side * 1e3 * (double)TORQUE);
        fprintf(f, "h816'/>\n");
    }
    draw_course(f, &angle, shown.angle, side_up);
    draw_course(f, &torque, shown.torque, 1e3);
    for (int i = 0; i < 2; i++) {
        const furuta_plan *p = &shown.plan[moment[i] / EVERY];
        const double start = moment[i] * (double)TICK, near = shown.angle[moment[i]] - (double)p->s[0].z[1]; /* turns */
        fprintf(f, "<path fill='none' stroke='%s' stroke-width='1.6' stroke-dasharray='6 4' d='", colour[i]);
        for (int k = 0; k <= furuta_steps; k++)
            put(f, &angle, k ? 'L' : 'M', start + k * (double)goal.dt, side_up * ((double)p->s[k].z[1] + near));
        for (int k = 0; k < 2 * furuta_steps; k++) /* held for a step each */
            put(f, &torque, k ? 'L' : 'M', start + (k + 1) / 2 * (double)goal.dt, 1e3 * (double)p->u[k / 2]);
        fprintf(f, "'/>\n");
    }
    fprintf(f, "</svg>\n");
    return fclose(f) != 0;
}

int main(int argc, char **argv)
{
    uint64_t seed = 1;
    double last[2] = {0, 0};
    int up[2] = {0, 0};
    for (int pose = 0; pose < POSES; pose++) {
        double q[2];
        for (int i = 0; i < 2; i++)
            q[i] = (i ? 0.2 : 0.6) * ((double)roln_uniform(&seed) - 0.5);
        for (int by_plans = 0; by_plans < 2; by_plans++) {
            const double since = up_since(q, by_plans);
            up[by_plans] += since >= 0, last[by_plans] = fmax(last[by_plans], since);
        }
    }
    for (int by_plans = 0; by_plans < 2; by_plans++)
        printf("%s swung up and held from %d poses: %d, the last after %.2f s\n", by_plans ? "plans:     " : "energy law:", POSES,
               up[by_plans], last[by_plans]);
    qsort(ms, (size_t)plans, sizeof ms[0], larger);
    printf("%d of %d plans reach the torque limit, %d torques are beyond it\n", full, plans, beyond);
    printf("a plan takes %.2f ms here; RAM: plan %u bytes, its scratch %u bytes\n", ms[plans / 2], (unsigned)sizeof mpc.plan,
           (unsigned)sizeof mpc.planwork);
    return argc > 1 ? draw(argv[1]) : 0;
}
