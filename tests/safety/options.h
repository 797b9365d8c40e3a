/* SPDX-License-Identifier: MIT */
/* options.h - a few small models that have every option of a config together: what misra.py and analyzers.sh look at. */
#ifndef OPTIONS_H
#define OPTIONS_H

#define ROLN_NAME one
#define ROLN_AE 6, 3
#define ROLN_MLP 4, 4
#define ROLN_BASE 1
#define ROLN_LAYERS gyro, gyro
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_LOAD 1
#define ROLN_DELAY 2
#define ROLN_INPUTS 2
#define ROLN_PLAN 4, 2
#define ROLN_GN_ROWS 20
#define ROLN_LEARN everything
#include "roln.h"

#define ROLN_NAME two
#define ROLN_AE 6, 3
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_INTEGRATOR midpoint
#define ROLN_GN_ROWS 20
#include "roln.h"

#define ROLN_NAME three
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_ANGLES 1, 0, 1
#define ROLN_SCALE each
#define ROLN_DAMPING 2
#define ROLN_FRICTION 2
#include "roln.h"

#define ROLN_NAME five
#define ROLN_AE 6, 3
#define ROLN_MLP 4
#define ROLN_ACTUATOR servo
#define ROLN_LOAD 1
#define ROLN_DELAY 2
#define ROLN_PLAN 4, 6
#define ROLN_GN_ROWS 20
#include "roln.h"

#define ROLN_NAME six
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_DRIVEN 1
#define ROLN_GN_ROWS 20
#include "roln.h"

#define ROLN_NAME eight
#define ROLN_AE 5, 3
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 2
#define ROLN_DRIVEN 1
#define ROLN_PLAN 4, 2
#define ROLN_GN_ROWS 20
#include "roln.h"

#define ROLN_NAME seven
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_FRICTION 2
#define ROLN_STICTION 1
#define ROLN_LOAD 1
#define ROLN_DELAY 2
#define ROLN_PLAN 4, 2
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME four
#define ROLN_AE 6, 3
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 4
#define ROLN_QUANTISE int8
#include "roln.h"
#endif

#endif
