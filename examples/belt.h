/* SPDX-License-Identifier: MIT */
/* belt.h - the model of examples/belt.c: three joints, a motor at each of the first two, a belt to the third. */
#ifndef BELT_H
#define BELT_H

#define ROLN_NAME     belt
#define ROLN_AE       3
#define ROLN_ANGLES   1, 1, 1
#define ROLN_MLP      16, 16
#define ROLN_DAMPING  1
#define ROLN_FRICTION 1
#define ROLN_HORIZON  25
#define ROLN_LOAD     1 /* a payload */
#define ROLN_DELAY    5 /* ticks from a torque that is sent to its effect */
#include "roln.h"

#endif
