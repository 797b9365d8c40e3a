/* SPDX-License-Identifier: MIT */
/* furuta.h - the model of examples/furuta.c: a Furuta pendulum, an arm that a motor turns about the vertical and a pendulum at
   its end. Both joints turn all round. */
#ifndef FURUTA_H
#define FURUTA_H

#define ROLN_NAME    furuta
#define ROLN_AE      2
#define ROLN_ANGLES  1, 1   /* the networks see cosine and sine of both */
#define ROLN_MLP     16, 16
#define ROLN_DAMPING 1      /* bearings, and the motor's back EMF */
#define ROLN_HORIZON 25     /* steps in a training window: half a second */
#define ROLN_PLAN    30, 1  /* steps of a plan, motors: mpc.c */
#include "roln.h"

#endif
