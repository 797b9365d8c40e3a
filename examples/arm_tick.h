/* SPDX-License-Identifier: MIT */
/* arm_tick.h - what runs in the controller of examples/arm.c: counts of six encoders and a reference in, six torques out. */
#ifndef ARM_TICK_H
#define ARM_TICK_H

#include "arm.h"
#include "arm_weights.h" /* static const arm_params arm_weights: flash */
#include "arm_limits.h"  /* static const arm_evidence arm_known: flash; as the trainer wrote it beside the weights */

#define TICK ROLN_C(0.001)           /* s */
#define STEPS 4096                   /* of an encoder's turn */
#define TURN ROLN_C(6.283185307179586)
#define LOST (-1 - 0x7fffffff)       /* a count that did not come */

static const roln_real most[arm_N] = {60, 120, 60, 15, 15, 8}; /* Nm */
static const roln_real stiff[arm_N] = {1200, 2400, 800, 48, 48, 16}; /* Nm/rad, about 30 rad/s */
static const roln_real damp[arm_N] = {80, 160, 52, ROLN_C(3.2), ROLN_C(3.2), ROLN_C(1.1)};
/* Novelty is that of arm_limits.h, rounded, and margin is twice that: after a training of your own write its numbers here. */
static const roln_limits limits = {.dt = TICK, .margin = ROLN_C(0.2), .hold = 5, .tau_each = most,
                                   .evidence = arm_known.L, .novelty = 211};

/* Encoders that round, and torques that the model misses, a twentieth of the largest; load is read with ROLN_LOAD 1 in arm.h. */
static const roln_real missed[arm_N] = {3, 6, 3, ROLN_C(0.75), ROLN_C(0.75), ROLN_C(0.4)};
static const roln_noise noise = {
    .dt = TICK, .q = TURN / STEPS / ROLN_C(3.4641), .gate = 8, .lost = 5, .tau_each = missed, .load = 4};

typedef struct {
    arm_filter filter; /* filter.s: z, zd */
    uint32_t seen;     /* bits of arm_filter_tick in this tick. Not bits of a guard: 1, 2 and 16 mean other things there */
    int gap;           /* ticks in a row that did not use every joint, at most noise.lost + 1 */
    arm_state x;       /* q, qd of the estimate */
    arm_latent s;      /* what arm_tick encodes of these */
    arm_target target;
    arm_guard guard;   /* guard.tau, Nm: to the motors */
    roln_real y[arm_N]; /* measured angles, rad; NAN: lost */
    arm_work work;
    arm_filter_tick_work filterwork;
} controller;

/* Angles and velocities from the counts of the encoders and the torques that were held since the last counts. Nonzero: there is an
   estimate to act on, in c->filter.s and c->x. A filter that starts has an estimate, at rest.
   The filter bridges a joint that is not measured without end, so this function counts: after noise.lost ticks in a row that
   lack a joint or reject one there is no estimate to act on until all are used again. A filter that starts again has lost its
   estimate, or has left out a joint in more than noise.lost ticks in a row: an encoder may have slipped. There is then no
   estimate to act on until somebody has found the cause and zeroes c->filter. */
static int observe(controller *c, const int count[arm_N], const roln_real tau[arm_N])
{
    for (int i = 0; i < arm_N; i++)
        c->y[i] = count[i] == LOST ? (roln_real)NAN : (roln_real)count[i] * (TURN / STEPS);
    c->seen = arm_filter_tick(&arm_weights, &noise, c->y, tau, &c->filter, &c->filterwork);
    c->gap = c->filter.f.used < arm_N ? ROLN_MIN(c->gap, noise.lost) + 1 : 0;
    return (c->seen & (ROLN_FILTER_NONE | ROLN_FAULT_STATUS)) == 0 && c->filter.f.starts < 2 && c->gap <= noise.lost &&
           arm_decode(&arm_weights, &c->filter.s, &c->x, &c->work.decode) == ROLN_OK;
}

/* One tick, 1 kHz: counts of the encoders and the reference in; c->guard.tau to the motors whatever happens. Returns the faults of
   the guard; those of the filter are in c->seen. */
static uint32_t controller_tick(controller *c, const int count[arm_N], const roln_real q[arm_N], const roln_real qd[arm_N],
                                const roln_real qdd[arm_N])
{
    if (!observe(c, count, c->guard.tau)) /* the guard then counts a bad tick, ROLN_FAULT_STATUS */
        return arm_guard_tick(&arm_weights, &limits, &c->x, NULL, NULL, &c->guard, &c->work.guard_tick);
    if (arm_encode_reference(&arm_weights, q, qd, qdd, &c->target, &c->work.encode_reference) != ROLN_OK ||
        arm_gains(&arm_weights, &c->filter.s, stiff, damp, &c->target, &c->work.gains) != ROLN_OK)
        return arm_guard_tick(&arm_weights, &limits, &c->x, &c->filter.s, NULL, &c->guard, &c->work.guard_tick);
    return arm_tick(&arm_weights, &limits, &c->x, &c->target, &c->s, &c->guard, &c->work.tick);
}

#endif
