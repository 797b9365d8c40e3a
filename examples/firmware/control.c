/* SPDX-License-Identifier: MIT */
/* control.c - control_tick.c as firmware: a latent controller and the guard, tick by tick. The plant is the model itself, one state
   in z that the tick sees only as q, qd; torques are in the model's own unit (control_tick.c).

   Every tick checks a few of the weights: all of them in 51 ticks, a quarter of a second. If a bit has flipped the motors go off.

   Every 20th tick is printed: distance from the reference, two torques, faults. At tick 60 one encoder fails for one tick: the
   torque is held. From tick 160 it is dead: held for five ticks, then off for good. */

#include "chain.h"
#include "chain_weights.h"
#include "text.h"

enum { N = chain_N, n = chain_n, TICKS = 180 };
#define TICK 0.005f /* s */
#define SPEED 8.0f  /* 1/s, of the closed loop */

static const roln_limits limits = { /* as in control_tick.c */
    .dt = TICK, .margin = 0.1f, .residual = 1, .tau = 200, .hold = 5, .q_tolerance = 0.05f, .qd_tolerance = 1};

static struct {
    chain_latent s;      /* z, zd of the last good tick */
    chain_target target; /* the pose to hold, at rest, and the gains */
    chain_guard guard;   /* guard.tau: to the motors */
    chain_work work;
    roln_check check;    /* of the weights */
} ctl;

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

/* What a timer interrupt calls: x in, ctl.guard.tau out whatever happens. Returns the faults. */
static uint32_t control_tick(const chain_state *x)
{
    if (chain_check(&chain_weights, 16, &ctl.check) != ROLN_OK) ctl.guard.g.faults |= ROLN_FAULT_EXPIRED; /* damaged: off */
    return chain_tick(&chain_weights, &limits, x, &ctl.target, &ctl.s, &ctl.guard, &ctl.work.tick);
}

/* A fault of the processor ends here first (board.h). */
void board_safe(void)
{
    memset(ctl.guard.tau, 0, sizeof ctl.guard.tau); /* and the motors off */
}

int main(void)
{
    static chain_latent plant, bent;
    static chain_work plant_work;
    static chain_state x, pose; /* zero: hanging, at rest */
    uint64_t hash = ROLN_FNV;
    uint32_t before = 0, most = 0;
    for (int i = 0; i < n; i++)
        bent.z[i] = 0.25f * chain_weights.z_min[i] + 0.75f * chain_weights.z_max[i];
    if (chain_encode(&chain_weights, &x, &plant, &plant_work.encode) != ROLN_OK ||
        chain_decode(&chain_weights, &bent, &pose, &plant_work.decode) != ROLN_OK || control_start(pose.q) != ROLN_OK ||
        chain_check(&chain_weights, chain_numbers, &ctl.check) != ROLN_OK) /* what they should be from here on */
        return 1;
    put_text("tick   |z-z_ref|         tau1         tau8  faults\n");
    for (int k = 0; k < TICKS; k++) {
        roln_real d = 0;
        if (chain_decode(&chain_weights, &plant, &x, &plant_work.decode) != ROLN_OK) return 1; /* "read the encoders" */
        if (k == 60 || k >= 160) x.q[3] = NAN;
        const uint32_t count = board_count(), faults = control_tick(&x), used = board_count() - count;
        if (used > most) most = used;
        for (int i = 0; i < n; i++)
            d += ROLN_ABS(plant.z[i] - ctl.target.z[i]);
        if (k % 20 == 0 || faults != before) {
            put_integer((uint32_t)k, 4);
            put_real(d, 4);
            put_real(ctl.guard.tau[0], 2);
            put_text(" ");
            put_real(ctl.guard.tau[7], 2);
            put_integer(faults, 8);
            put_text(faults & ROLN_FAULT_EXPIRED ? " torque off\n" : faults ? " torque held\n" : "\n");
        }
        before = faults;
        hash = roln_fnv((int)sizeof ctl.guard.tau, (const unsigned char *)ctl.guard.tau, hash);
        if (chain_step(&chain_weights, &plant, ctl.guard.tau, TICK, &plant_work.step) != ROLN_OK) return 1;
    }
    put_text("hash of the torques ");
    put_hex(hash, 16);
    put_text("\ninstructions of a tick ");
    put_integer(most, 0);
    put_text("\n");
    return 0;
}
