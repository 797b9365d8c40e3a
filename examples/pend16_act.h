/* pend16_act.h - pend16 with layers in place of a chart, trained with torques: the model of closed loops (tests/control). */
#ifndef PEND16_ACT_H
#define PEND16_ACT_H

#define ROLN_NAME pend16_act
#define ROLN_AE 16, 16, 16, 16, 12, 8, 4 /* layers that keep their size bend without reducing */
#define ROLN_SLOPE 0.6
#define ROLN_MLP 64, 64
#define ROLN_STEP rk4
#define ROLN_HORIZON 16
#include "roln.h"

#endif
