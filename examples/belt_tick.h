/* SPDX-License-Identifier: MIT */
/* belt_tick.h - what runs in the controller of examples/belt.c: counts of three encoders and a reference in, two torques out. */
#ifndef BELT_TICK_H
#define BELT_TICK_H

#include "belt.h"
#include "belt_weights.h" /* static const belt_params belt_weights: flash */
#include "belt_limits.h"  /* belt_noise, belt_limits: as the trainer wrote them */

enum { STEPS = 16384 }; /* of an encoder's turn */
#define TICK ROLN_C(0.001)
#define TURN ROLN_C(6.283185307179586)

static const roln_real most[MOTORS] = {60, 40}; /* Nm */
/* about w^2 M_jj and 2 w M_jj at w = 25 rad/s: Nm/rad, Nms/rad */
static const roln_real stiff[belt_N] = {1000, 330, 0}, damp[belt_N] = {70, 23, 0};
static const roln_real motor_at[belt_N * MOTORS] = {1, 0, 0, 1, 0, 0}; /* B: at the first two joints */
static const roln_motors motors = {MOTORS, motor_at, ROLN_C(0.01)}; /* mu: a hundredth of the largest number of J^T B */

typedef struct {
    belt_filter filter; /* filter.s: z, zd; filter.load */
    uint32_t seen;      /* bits of belt_filter_tick in this tick. Not bits of a guard: 1, 2 and 16 mean other things there */
    belt_state x;       /* q, qd of the estimate */
    belt_latent s;      /* what belt_tick encodes of these */
    belt_target target;
    belt_guard guard; /* guard.tau, Nm: to the motors; guard.sent: on their way */
    roln_limits limits;
    roln_noise noise;
    belt_work work;
    belt_filter_tick_work filterwork;
} controller;

/* Limits and noise are those of belt_limits.h, but: the torque that the motors can make; no limit of its rate and no check of the
   energy, since the recordings are smooth and this controller is not; a load. */
static void controller_start(controller *c)
{
    memset(c, 0, sizeof *c);
    c->limits = belt_limits;
    c->limits.motors = &motors, c->limits.tau_each = most;
    c->limits.rate = 0, c->limits.rate_each = NULL;
    c->limits.residual = 0;
    c->noise = belt_noise;
    c->noise.load = 4; /* Nm/sqrt(s), of every joint */
    c->target.load = c->filter.load;
}

/* One tick, 1 kHz: counts of the encoders in, and the reference of the time at which the torque will act; c->guard.tau to the
   motors whatever happens. Returns the faults of the guard; those of the filter are in c->seen. A filter that starts has an
   estimate, at rest, so the tick goes on with ROLN_FILTER_START, but only the first time: one that starts again may have believed
   an encoder that slipped. */
static uint32_t controller_tick(controller *c, const int count[belt_N], const roln_real q[belt_N], const roln_real qd[belt_N],
                                const roln_real qdd[belt_N])
{
    roln_real y[belt_N], tau[belt_N] = {c->guard.sent[0][0], c->guard.sent[0][1], 0}; /* what acted since the last tick */
    for (int i = 0; i < belt_N; i++)
        y[i] = (roln_real)count[i] * (TURN / STEPS);
    c->seen = belt_filter_tick(&belt_weights, &c->noise, y, tau, &c->filter, &c->filterwork);
    if ((c->seen & (ROLN_FILTER_NONE | ROLN_FAULT_STATUS)) || c->filter.f.starts > 1 ||
        belt_decode(&belt_weights, &c->filter.s, &c->x, &c->work.decode) != ROLN_OK ||
        belt_encode_reference(&belt_weights, q, qd, qdd, &c->target, &c->work.encode_reference) != ROLN_OK ||
        belt_gains(&belt_weights, &c->filter.s, stiff, damp, &c->target, &c->work.gains) != ROLN_OK)
        return belt_guard_tick(&belt_weights, &c->limits, &c->x, NULL, NULL, &c->guard, &c->work.guard_tick);
    return belt_tick(&belt_weights, &c->limits, &c->x, &c->target, &c->s, &c->guard, &c->work.tick);
}

#endif
