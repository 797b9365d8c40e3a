/* control_tick.c - what runs in the controller: weights in flash, static memory, one bounded tick.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/control_tick.c -o control_tick -lm

   Holds the chain of pendulum.c in a bent pose. The plant is the model itself, one state that the tick sees only as q, qd.
   chain_weights.h was trained without known forces, so its torques are in the model's own unit; on a real chain multiply
   them by the factor that pendulum.c fits to one known energy. */

#include <stdio.h>
#include "chain.h"
#include "chain_weights.h" /* static const chain_params chain_weights: flash */

enum { N = chain_N, n = chain_n };
#define TICK ROLN_C(0.005) /* s */
#define SPEED ROLN_C(8.0)  /* 1/s, of the closed loop */

typedef struct {
    chain_latent ref;    /* z_ref, at rest */
    roln_real M[n * n];  /* M(z_ref): Kp = SPEED^2 M, Kd = 2 SPEED M */
    chain_state next;    /* q, qd predicted for the next tick: to watch the plant */
    chain_work work;
} controller;
static controller ctl; /* RAM */

/* z_ref = rho(q_ref), zd_ref = 0. */
static roln_status control_start(controller *c, const chain_state *x_ref)
{
    const roln_status st = chain_encode(&chain_weights, x_ref, &c->ref, &c->work);
    if (st != ROLN_OK) return st;
    return chain_terms(&chain_weights, &c->ref, c->M, NULL, NULL, NULL, NULL, &c->work);
}

/* One tick: x in, tau [N] out, which is zero unless ROLN_OK. */
static roln_status control_tick(controller *c, const chain_state *x, roln_real tau[N])
{
    chain_latent s;
    roln_real g[n], tau_z[n], lifted[N];
    roln_status st;
    memset(tau, 0, N * sizeof *tau);
    st = chain_encode(&chain_weights, x, &s, &c->work); /* z = rho(q), zd = D(q) qd */
    if (st != ROLN_OK) return st;
    if (!chain_in_range(&chain_weights, &s)) return ROLN_E_RANGE; /* never trust the model where it was not trained */
    st = chain_terms(&chain_weights, &s, NULL, NULL, g, NULL, NULL, &c->work); /* g = dV/dz */
    if (st != ROLN_OK) return st;
    for (int i = 0; i < n; i++) { /* tau_z = g - Kp (z - z_ref) - Kd zd */
        tau_z[i] = g[i];
        for (int j = 0; j < n; j++)
            tau_z[i] -= c->M[i * n + j] * (SPEED * SPEED * (s.z[j] - c->ref.z[j]) + 2 * SPEED * s.zd[j]);
    }
    st = chain_lift(&chain_weights, &s, tau_z, lifted, &c->work); /* tau = D(phi(z))^T tau_z */
    if (st == ROLN_OK) st = chain_step(&chain_weights, &s, lifted, TICK, &c->work); /* M zdd + c + g = J^T tau */
    if (st == ROLN_OK) st = chain_decode(&chain_weights, &s, &c->next, &c->work);   /* q = phi(z), qd = J zd */
    if (st == ROLN_OK) memcpy(tau, lifted, N * sizeof *tau);
    return st;
}

int main(void)
{
    static chain_latent plant, target;
    static chain_work plant_work;
    static chain_state x, x_ref; /* zero: hanging, at rest */
    roln_real tau[N];
    for (int i = 0; i < n; i++)
        target.z[i] = ROLN_C(0.25) * chain_weights.z_min[i] + ROLN_C(0.75) * chain_weights.z_max[i];
    printf("flash: weights %u bytes    RAM: controller %u bytes, of them scratch %u\n\n"
           "  tick      q1      q5      q8  |z-z_ref|  status\n",
           (unsigned)sizeof chain_weights, (unsigned)sizeof ctl, (unsigned)sizeof ctl.work);
    if (chain_encode(&chain_weights, &x, &plant, &plant_work) != ROLN_OK ||
        chain_decode(&chain_weights, &target, &x_ref, &plant_work) != ROLN_OK || control_start(&ctl, &x_ref) != ROLN_OK)
        return 1;
    for (int k = 0; k <= 200; k++) {
        roln_status st;
        chain_decode(&chain_weights, &plant, &x, &plant_work); /* "read the encoders" */
        if (k == 50) x.q[3] = (roln_real)NAN;                  /* a broken one */
        st = control_tick(&ctl, &x, tau);
        if (k % 20 == 0 || st != ROLN_OK)
            printf("%6d %7.3f %7.3f %7.3f %10.4f %7d%s\n", k, (double)x.q[0], (double)x.q[4], (double)x.q[7],
                   (double)(ROLN_ABS(plant.z[0] - ctl.ref.z[0]) + ROLN_ABS(plant.z[1] - ctl.ref.z[1])), (int)st,
                   st == ROLN_OK ? "" : "  zero torque");
        chain_step(&chain_weights, &plant, tau, TICK, &plant_work);
    }
    return 0;
}
