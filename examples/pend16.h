/* pend16.h - chain of 16 pendulums that moves on a 4-dimensional manifold (tests/mujoco). */
#define ROLN_NAME pend16
#ifndef PEND16_AE
#define PEND16_AE 16, 12, 8, 4
#endif
#define ROLN_AE PEND16_AE
#define ROLN_MLP 64, 64
#ifdef PEND16_SLOPE
#define ROLN_SLOPE PEND16_SLOPE
#endif
#define ROLN_STEP rk4
#define ROLN_HORIZON 16
#include "roln.h"
