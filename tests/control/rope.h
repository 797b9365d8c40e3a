/* SPDX-License-Identifier: MIT */
/* rope.h - the model of tests/control/rope.c: a rope of ten links below a trolley, 11 joints, in six coordinates. */
#ifndef ROPE_H
#define ROPE_H

#define ROLN_NAME    rope
#define ROLN_AE      11, 6
#define ROLN_CHART   polynomial, 2
#define ROLN_MLP     32, 32
#define ROLN_DAMPING 1
#define ROLN_HORIZON 25
#define ROLN_PLAN    50, 2 /* steps, motors */
#include "roln.h"

#endif
