/* SPDX-License-Identifier: MIT */
/* models.h - a large model, a small one, one with every option, one with the Cholesky head, polynomials, charts, stored ones: what
   warnings.sh and symbols.sh compile. */
#ifndef MODELS_H
#define MODELS_H

#define ROLN_NAME big
#define ROLN_AE 600, 128, 64, 32, 10
#define ROLN_MLP 64, 64
#include "roln.h"

#define ROLN_NAME small
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_BASE 1
#define ROLN_INTEGRATOR midpoint
#include "roln.h"

#define ROLN_NAME layered
#define ROLN_AE 8, 6, 3
#define ROLN_MLP 16, 16
#define ROLN_BASE 1
#define ROLN_LAYERS gyro, gyro
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_PLAN 10, 2
#define ROLN_GN_ROWS 100
#define ROLN_LEARN everything
#include "roln.h"

#define ROLN_NAME delan
#define ROLN_AE 4
#define ROLN_MLP 16, 16
#define ROLN_MASS cholesky
#define ROLN_GN_ROWS 50
#include "roln.h"

#define ROLN_NAME crane
#define ROLN_AE 3
#define ROLN_POLYNOMIALS 2, 4
#define ROLN_MASS squares, 5
#define ROLN_ANGLES 0, 1, 1
#define ROLN_DAMPING 1
#define ROLN_PLAN 10, 2
#define ROLN_GN_ROWS 50
#include "roln.h"

#define ROLN_NAME wheels
#define ROLN_AE 3
#define ROLN_MLP 16, 16
#define ROLN_ANGLES 1, 0, 1
#define ROLN_FRICTION 1
#define ROLN_LOAD 1
#define ROLN_DELAY 5
#define ROLN_PLAN 20, 2
#define ROLN_GN_ROWS 50
#include "roln.h"

#define ROLN_NAME servos /* drives in a fluid */
#define ROLN_AE 3
#define ROLN_MLP 16, 16
#define ROLN_DAMPING 2
#define ROLN_FRICTION 2
#define ROLN_PLAN 10, 2
#define ROLN_GN_ROWS 50
#include "roln.h"

#define ROLN_NAME carts /* sliders and hinges */
#define ROLN_AE 6, 3
#define ROLN_MLP 16, 16
#define ROLN_SCALE each
#define ROLN_GN_ROWS 50
#include "roln.h"

#define ROLN_NAME chart
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 16, 16
#include "roln.h"

#define ROLN_NAME modes
#define ROLN_AE 600, 80, 10
#define ROLN_SLOPE 1
#define ROLN_CHART polynomial, 3
#define ROLN_MLP 32, 32
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME chart_bytes
#define ROLN_AE 16, 8, 4
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 16, 16
#define ROLN_QUANTISE int8
#include "roln.h"

#define ROLN_NAME bytes
#define ROLN_AE 600, 128, 64, 32, 10
#define ROLN_MLP 64, 64
#define ROLN_QUANTISE int8
#include "roln.h"

#define ROLN_NAME halves
#define ROLN_AE 8, 6, 3
#define ROLN_MLP 16, 16
#define ROLN_QUANTISE half
#include "roln.h"
#endif

#endif
