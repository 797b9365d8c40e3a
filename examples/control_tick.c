/* SPDX-License-Identifier: MIT */
/* control_tick.c - what runs in the controller: weights in flash, static memory, one bounded tick.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/control_tick.c -o control_tick -lm

   Holds the chain of pendulum.c in a bent pose. The plant is the model itself, one state that the tick sees only as q, qd. An
   encoder breaks for a tick, later for 20 ticks: the guard lets go, and nothing moves the motors until it is armed again.

   chain_weights.h was trained without known forces, so every energy, torque, power and gain of the model is in a unit of its
   own: JOULE of it are one joule, JOULE of a torque one newton metre. pendulum.c fits that number to a known energy. */

#include <stdio.h>
#include "chain.h"
#include "chain_weights.h" /* static const chain_params chain_weights: flash */

enum { N = chain_N, n = chain_n };
#define TICK ROLN_C(0.005)    /* s */
#define SPEED ROLN_C(8.0)     /* 1/s, of the closed loop */
#define JOULE ROLN_C(19.8328) /* 1 J = 19.8328 of the model: first line of chain_weights.h */

static const roln_limits limits = {
    .dt = TICK,
    .margin = ROLN_C(0.1), /* of the range seen in training */
    .residual = ROLN_C(0.01) *
                JOULE,           /* 0.01 W: three times the largest residual here, rounding (a real chain: of a recorded run) */
    .tau = ROLN_C(4.6) * JOULE,  /* 4.6 N m, 1.5 times the largest torque here. What is beyond is clipped */
    .hold = 5,                   /* bad ticks that are bridged */
    .q_tolerance = ROLN_C(0.05), /* rad */
    .qd_tolerance = 1};          /* rad/s */

static struct {
    chain_latent s;      /* z, zd of the last tick that could be encoded */
    chain_target target; /* the pose to hold, at rest, and the gains */
    chain_guard guard;   /* guard.tau / JOULE: to the motors; zeroed: a fresh start */
    chain_work work;
} ctl; /* RAM */

/* Hold the pose q, with gains SPEED^2 and 2 SPEED times the diagonal of M there. */
static roln_status control_start(const roln_real q[N])
{
    static const roln_real rest[N];
    chain_equation at;
    roln_status st = chain_encode_reference(&chain_weights, q, rest, rest, &ctl.target, &ctl.work.encode_reference);
    memcpy(ctl.s.z, ctl.target.z, sizeof ctl.s.z);
    if (st == ROLN_OK) st = chain_dynamics(&chain_weights, &ctl.s, &at, &ctl.work.dynamics);
    for (int i = 0; i < n && st == ROLN_OK; i++) {
        ctl.target.kp[i] = SPEED * SPEED * at.M[i * (n + 1)];
        ctl.target.kd[i] = 2 * SPEED * at.M[i * (n + 1)];
    }
    return st;
}

/* After ROLN_FAULT_EXPIRED the torque is 0 until somebody who has looked at the machine says that it may move again. */
static void control_arm(void)
{
    memset(&ctl.guard.g, 0, sizeof ctl.guard.g);
}

/* What a timer interrupt calls: x measured, motor out whatever happens. z = rho(q), zd = D(q) qd; PD+ on M, C, g;
   tau = D^T tau_z; the guard. With a controller of your own: chain_encode, chain_dynamics .., chain_lift, chain_guard_tick. motor:
   N m, to the motors. Returns the faults. */
static uint32_t control_tick(const chain_state *x, roln_real motor[N])
{
    const uint32_t faults = chain_tick(&chain_weights, &limits, x, &ctl.target, &ctl.s, &ctl.guard, &ctl.work.tick);
    for (int i = 0; i < N; i++)
        motor[i] = ctl.guard.tau[i] / JOULE;
    return faults;
}

int main(void)
{
    static chain_latent plant, bent;
    static chain_work plant_work;
    static chain_state x, pose; /* zero: hanging, at rest */
    roln_real motor[N], tau[N];
    uint32_t before = 0;
    for (int i = 0; i < n; i++)
        bent.z[i] = ROLN_C(0.25) * chain_weights.z_min[i] + ROLN_C(0.75) * chain_weights.z_max[i];
    printf("flash: weights %u bytes    RAM: controller %u bytes, of them scratch %u\n\n"
           "  tick      q1      q5      q8  |z-z_ref| tau1,Nm tau8,Nm  faults\n",
           (unsigned)sizeof chain_weights, (unsigned)sizeof ctl, (unsigned)sizeof ctl.work);
    if (chain_encode(&chain_weights, &x, &plant, &plant_work.encode) != ROLN_OK ||
        chain_decode(&chain_weights, &bent, &pose, &plant_work.decode) != ROLN_OK || control_start(pose.q) != ROLN_OK)
        return 1;
    for (int k = 0; k <= 340; k++) {
        uint32_t faults;
        if (chain_decode(&chain_weights, &plant, &x, &plant_work.decode) != ROLN_OK) return 1; /* "read the encoders" */
        if (k == 50 || (k > 180 && k <= 200)) x.q[3] = (roln_real)NAN; /* a broken one */
        if (k == 205) control_arm();
        faults = control_tick(&x, motor);
        if (k % 20 == 0 || faults != before)
            printf("%6d %7.3f %7.3f %7.3f %10.4f %7.3f %7.3f  %u%s\n", k, (double)x.q[0], (double)x.q[4], (double)x.q[7],
                   (double)(ROLN_ABS(plant.z[0] - ctl.target.z[0]) + ROLN_ABS(plant.z[1] - ctl.target.z[1])),
                   (double)motor[0], (double)motor[7], (unsigned)faults,
                   faults & ROLN_FAULT_EXPIRED ? " torque off" : faults ? " torque held" : k == 205 ? " armed again" : "");
        before = faults;
        for (int i = 0; i < N; i++) /* the plant is a model, so back into its unit */
            tau[i] = motor[i] * JOULE;
        if (chain_step(&chain_weights, &plant, tau, TICK, &plant_work.step) != ROLN_OK) return 1;
    }
    return 0;
}
