/* SPDX-License-Identifier: MIT */
/* furuta_tick.h - what runs in the controller of examples/furuta.c: counts of two encoders in, a torque out. */
#ifndef FURUTA_TICK_H
#define FURUTA_TICK_H

#include "furuta.h"
#include "furuta_weights.h" /* static const furuta_params furuta_weights: flash */
#include "furuta_limits.h"  /* static const furuta_evidence furuta_known: flash; as the trainer wrote it beside the weights */

#define TICK ROLN_C(0.001)    /* s */
#define TORQUE ROLN_C(0.04)   /* Nm, of the motor */
#define STEPS 4096            /* of an encoder's turn */
#define PI ROLN_C(3.14159265)

static const roln_real motor_at[2] = {1, 0}; /* B: at the arm alone */
static const roln_motors motors = {1, motor_at, 0};
/* Novelty is that of furuta_limits.h, rounded. Margin is about twice that: a swing-up is faster than what was recorded. After a
   training of your own write its numbers here. */
static const roln_limits limits = {.dt = TICK, .margin = 1, .tau = TORQUE, .hold = 5, .motors = &motors,
                                   .evidence = furuta_known.L, .novelty = 189};
static const furuta_latent upright = {{0, PI}, {0, 0}};

typedef struct {
    furuta_state x;      /* q, qd */
    furuta_guard guard;  /* guard.tau[0], Nm: to the motor */
    roln_real K[4];      /* feedback about upright */
    roln_real goal, gap; /* energies: that of upright and a tenth more of what it is above hanging, and that gap */
    int started, caught;
    furuta_work work;
    furuta_lqr_work lqrwork;
} controller;

/* Feedback of least cost about upright: as bad as each other are 1 rad of the arm, .1 rad of the pendulum, their velocities of 5
   and 1 rad/s, and .01 Nm. */
static roln_status controller_start(controller *c)
{
    static const roln_real q[2] = {1, 100}, qd[2] = {ROLN_C(0.04), 1}, u[1] = {10000};
    static const furuta_latent hanging = {{0}, {0}};
    const roln_cost cost = {.q = q, .qd = qd, .u = u, .dt = TICK, .motors = &motors};
    furuta_equation up = {.V = 0}, down = {.V = 0};
    roln_status st;
    memset(c, 0, sizeof *c);
    st = furuta_dynamics(&furuta_weights, &upright, &up, &c->work.dynamics);
    if (st == ROLN_OK) st = furuta_dynamics(&furuta_weights, &hanging, &down, &c->work.dynamics);
    c->gap = up.V - down.V, c->goal = up.V + c->gap / 10;
    return st == ROLN_OK ? furuta_lqr(&furuta_weights, &cost, &upright, NULL, c->K, NULL, &c->lqrwork) : st;
}

/* Angles and velocities from what the encoders count: a tracking filter for each, critically damped. */
static void track(controller *c, const int count[2])
{
    const roln_real pole = ROLN_C(0.9), alpha = 1 - pole * pole, beta = (1 - pole) * (1 - pole) / TICK;
    for (int i = 0; i < 2; i++) {
        const roln_real measured = (roln_real)count[i] * (2 * PI / STEPS), ahead = c->x.q[i] + TICK * c->x.qd[i];
        const roln_real e = roln_wrap(measured - ahead);
        c->x.q[i] = c->started ? roln_wrap(ahead + alpha * e) : measured;
        c->x.qd[i] = c->started ? c->x.qd[i] + beta * e : 0;
    }
    c->started = 1;
}

/* Swings up. The pendulum's energy, 1/2 M_22 qd_2^2 + V, changes by -M_21 qd_2 a where the arm is accelerated by a: towards the
   goal, and beside that the arm goes back to 0. The torque of a is that of M qdd + c + g + d = (u, 0), whose second row says how
   the pendulum is accelerated, b. */
static roln_status swing(controller *c, const furuta_latent *s, roln_real *u)
{
    furuta_equation e;
    const roln_status st = furuta_dynamics(&furuta_weights, s, &e, &c->work.dynamics);
    roln_real missing, a, b;
    if (st != ROLN_OK) return st;
    missing = (c->goal - e.V - e.M[3] / 2 * s->zd[1] * s->zd[1]) / c->gap;
    a = -20 * missing * e.M[2] / e.M[3] * s->zd[1] - 10 * s->z[0] - 4 * s->zd[0];
    b = -(e.M[2] * a + e.c[1] + e.g[1] + e.d[1]) / e.M[3];
    *u = e.M[0] * a + e.M[1] * b + e.c[0] + e.g[0] + e.d[0];
    return ROLN_OK;
}

/* One tick, 1 kHz: counts of the encoders in; c->guard.tau[0] to the motor whatever happens. Feedback from .3 rad of upright on, as
   long as it is within 1 rad. Returns the faults. */
static uint32_t controller_tick(controller *c, const int count[2])
{
    furuta_latent s;
    roln_real e[4], u = 0;
    roln_status st;
    track(c, count);
    st = furuta_encode(&furuta_weights, &c->x, &s, &c->work.encode);
    if (st == ROLN_OK) {
        for (int i = 0; i < 2; i++)
            e[i] = roln_wrap(s.z[i] - upright.z[i]), e[2 + i] = s.zd[i];
        c->caught = ROLN_ABS(e[1]) < (c->caught ? 1 : ROLN_C(0.3));
        if (c->caught) u = -roln_dot(4, c->K, e);
        else st = swing(c, &s, &u);
    }
    return furuta_guard_tick(&furuta_weights, &limits, &c->x, st == ROLN_OK ? &s : NULL, st == ROLN_OK ? &u : NULL, &c->guard,
                             &c->work.guard_tick);
}

#endif
