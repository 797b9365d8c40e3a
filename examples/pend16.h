/* pend16.h - chain of 16 pendulums that moves on a manifold of 4 dimensions (tests/mujoco): the model of README. */
#ifndef PEND16_H
#define PEND16_H

#define ROLN_NAME pend16
#define ROLN_AE 16, 16, 16, 16, 12, 8, 4 /* layers that keep their size bend without reducing */
#define ROLN_SLOPE 0.6
#define ROLN_MLP 64, 64
#define ROLN_STEP rk4
#define ROLN_HORIZON 16
#include "roln.h"

#endif
