/* SPDX-License-Identifier: MIT */
/* Measure once, look one second ahead. The weights lie in flash, all else is static; chain_weights.h is a chain of eight joints
   that roln learned from recordings. */
#include <stdio.h>
#include "chain.h"
#include "chain_weights.h"

static chain_state x = {{0.3f, 0.05f, -0.02f, 0.01f, 0.4f}, {0}}; /* measured q, qd */
static chain_latent s;
static chain_work work;

@ENTRY@
{
    int k;
    roln_status st = chain_encode(&chain_weights, &x, &s, &work.encode);
    for (k = 0; k < 200 && st == ROLN_OK; k++) /* NULL: no torque */
        st = chain_step(&chain_weights, &s, NULL, 0.005f, &work.step);
    if (st == ROLN_OK) st = chain_decode(&chain_weights, &s, &x, &work.decode);
    printf("roln " ROLN_VERSION ": status %d, mrad:", (int)st);
    for (k = 0; k < chain_N; k++)
        printf(" %d", (int)(1000 * x.q[k]));
    printf("\n");
}
