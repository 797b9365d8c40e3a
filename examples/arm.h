/* SPDX-License-Identifier: MIT */
/* arm.h - the model of examples/arm.c: an arm with 6 joints and a motor at each. */
#ifndef ARM_H
#define ARM_H

#define ROLN_NAME    arm
#define ROLN_AE      6
#define ROLN_MLP     16, 16
#define ROLN_DAMPING 1 /* bearings and gears */
#define ROLN_HORIZON 25
#include "roln.h"

#endif
