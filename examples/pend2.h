/* SPDX-License-Identifier: MIT */
/* pend2.h - double pendulum, full order: no autoencoder (tests/mujoco). */
#ifndef PEND2_H
#define PEND2_H

#define ROLN_NAME pend2
#define ROLN_AE 2
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR rk4
#define ROLN_HORIZON 25 /* half a second in steps of 20 ms */
#include "roln.h"

#endif
