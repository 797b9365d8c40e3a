/* SPDX-License-Identifier: MIT */
/* swift.h - the chain of examples/pend16.h and its weights, for plans: one stage a step, motors on joints 0, 4, 8, 12. */
#ifndef SWIFT_H
#define SWIFT_H

#ifndef SWIFT_STEPS
#define SWIFT_STEPS 20
#endif
#define ROLN_NAME swift
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR euler
#define ROLN_PLAN SWIFT_STEPS, 4
#include "roln.h"

enum { SWIFT_N = 16, SWIFT_MOTORS = 4, SWIFT_JOINT = 4 }; /* motor k on joint 4 k */
#define SWIFT_B {[0] = 1, [4 * 4 + 1] = 1, [8 * 4 + 2] = 1, [12 * 4 + 3] = 1} /* [16][4] */
#define SWIFT_DT 0.02

/* The cost: .1 rad of a joint, .7 rad/s of it, and the limit of a motor are as bad as each other. */
#define SWIFT_Q 1
#define SWIFT_QD 0.02
#define SWIFT_U(limit) (0.01 / ((limit) * (limit)))

#endif
