/* SPDX-License-Identifier: MIT */
/* cloth.h - cloth falling on a sphere, no forces given, layers (tests/experiments, cloth-free-paper): 600 sliders, n = 10. */
#ifndef CLOTH_H
#define CLOTH_H

#define ROLN_NAME cloth
#define ROLN_AE 600, 48, 48, 48, 48, 32, 10
#define ROLN_SLOPE 0.6
#define ROLN_MLP 64, 64
#define ROLN_DAMPING 1
#define ROLN_INTEGRATOR rk4
#include "roln.h"

#endif
