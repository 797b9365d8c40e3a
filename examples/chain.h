/* SPDX-License-Identifier: MIT */
/* chain.h - the model of examples/pendulum.c and control_tick.c: 8 joints, 2 of them free. All that gives the weights
   their meaning. No comment behind the name, the prefix of every generated one: Arduino's preprocessor would paste it in. */
#ifndef CHAIN_H
#define CHAIN_H

#define ROLN_NAME    chain
#define ROLN_AE      8, 2          /* 8 joint angles -> 2 latent coordinates .. */
#define ROLN_CHART   polynomial, 3 /* .. and back by a polynomial of degree 3 */
#define ROLN_MLP     16, 16        /* hidden widths of the mass and the potential network */
#define ROLN_INTEGRATOR    rk4
#define ROLN_HORIZON 8             /* steps in a training window */
#include "roln.h"

#endif
