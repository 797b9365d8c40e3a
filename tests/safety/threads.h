/* SPDX-License-Identifier: MIT */
/* threads.h - the model of threads.c and interrupts.c, and what a context does with it: a row of calls of everything that predicts
   and controls, of which only the bits of the results count. */
#ifndef THREADS_H
#define THREADS_H

#define ROLN_NAME arm
#define ROLN_AE 6, 5, 2
#define ROLN_MLP 4, 4
#define ROLN_DAMPING 1
#define ROLN_LOAD 1
#define ROLN_GN_ROWS 8
#define ROLN_PLAN 3, 6
#include "roln.h"

#include <stdio.h>
#include <string.h>

static arm_params p; /* one for all, constant once made */

/* What a context has to itself. */
typedef struct {
    arm_work work;
    arm_linear_work linwork;
    arm_lqr_work lqrwork;
    arm_filter_tick_work filterwork;
    arm_plan_next_work planwork;
    arm_train train;
} scratch;

/* Everything that calls write. */
typedef struct {
    arm_latent s;
    arm_state x;
    arm_target r;
    arm_guard g;
    arm_filter f;
    arm_plan plan;
    arm_jacobian j;
    arm_equation e;
    roln_real K[12 * arm_n], P[4 * arm_n * arm_n], tau_z[arm_n], tau[arm_N];
    unsigned long long statuses; /* how many were not ROLN_OK, faults and all */
} results;

static const roln_limits limits = {.dt = ROLN_C(0.01), .margin = 100, .tau = 50, .hold = 5, .residual = 1000};

ROLN_FN void make_model(void)
{
    static arm_start start;
    uint64_t seed = 5;
    int i;
    if (arm_init(&p, &seed, &start.init) != ROLN_OK) printf("no model\n");
    p.dt = limits.dt;
    for (i = 0; i < arm_n; i++)
        p.z_min[i] = -2, p.z_max[i] = 2, p.zd_max[i] = 10;
}

/* A state of its own for every seed. */
ROLN_FN void begin(uint64_t seed, results *o)
{
    int i;
    memset(o, 0, sizeof *o);
    for (i = 0; i < arm_n; i++)
        o->s.z[i] = roln_uniform(&seed) - ROLN_C(0.5), o->s.zd[i] = roln_uniform(&seed), o->r.kp[i] = 10, o->r.kd[i] = 1;
}

/* Call number k, of CALLS. */
enum { TICK, STEP, ENCODE, TERMS, CONTROL, LINEAR, FILTER, LQR, PLAN, CALLS };
ROLN_FN void call(int k, results *o, scratch *w)
{
    static const roln_real ones[6] = {1, 1, 1, 1, 1, 1}, none[6] = {0};
    static const roln_noise noise = {.dt = ROLN_C(0.01), .q = ROLN_C(0.01), .tau = 1, .gate = 5, .lost = 3, .load = 1};
    const roln_term term = {.of = ROLN_OF_Q, .weight = ones, .ref = none};
    const roln_goal goal = {.dt = ROLN_C(0.01), .terms = 1, .term = &term, .u = ones, .limits = &limits};
    const roln_cost cost = {ones, ones, ones, ROLN_C(0.01), NULL};
    arm_latent s = o->s;
    switch (k) {
    case TICK: o->statuses += arm_tick(&p, &limits, &o->x, &o->r, &s, &o->g, &w->work.tick); break;
    case STEP: o->statuses += arm_step(&p, &o->s, o->g.tau, limits.dt, &w->work.step) != ROLN_OK; break;
    case ENCODE:
        o->statuses += arm_decode(&p, &o->s, &o->x, &w->work.decode) != ROLN_OK;
        o->statuses += arm_encode(&p, &o->x, &s, &w->work.encode) != ROLN_OK;
        break;
    case LINEAR: o->statuses += arm_linear(&p, &s, o->g.tau, limits.dt, &o->j, &w->linwork) != ROLN_OK; break;
    case TERMS: o->statuses += arm_dynamics(&p, &o->s, &o->e, &w->work.dynamics) != ROLN_OK; break;
    case CONTROL:
        o->statuses += arm_control(&p, &o->s, &o->r, o->tau_z, &w->work.control) != ROLN_OK;
        o->statuses += arm_lift(&p, &o->s, o->tau_z, o->tau, &w->work.lift) != ROLN_OK;
        break;
    case FILTER: o->statuses += arm_filter_tick(&p, &noise, o->x.q, o->g.tau, &o->f, &w->filterwork) & ROLN_FAULT_STATUS; break;
    case LQR: o->statuses += arm_lqr(&p, &cost, &o->s, NULL, o->K, o->P, &w->lqrwork) != ROLN_OK; break;
    default: o->statuses += arm_plan_next(&p, &goal, &o->s, &o->plan, &w->planwork) != ROLN_OK; break;
    }
}

#endif
