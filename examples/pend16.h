/* SPDX-License-Identifier: MIT */
/* pend16.h - chain of 16 pendulums that moves on a manifold of 4 dimensions (tests/mujoco). */
#ifndef PEND16_H
#define PEND16_H

#define ROLN_NAME pend16
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR rk4
#define ROLN_HORIZON 25 /* half a second in steps of 20 ms */
#include "roln.h"

#endif
