/* SPDX-License-Identifier: MIT */
/* small_models.h - small models of every kind, by called.h. May be included again for variants of them all: names SMALL(plain) ..,
   and for all another integrator, no inputs, a load, units of their own, rows of Gauss-Newton. SMALL_DRIVEN_ONLY: the three with
   learned inputs alone. OF_ACTUATORS, OF_DRIVEN: in place of these models those with learned actuators, or with driven joints. */
#ifndef SMALL
#define SMALL(name) name
#endif
#ifndef SMALL_STEP
#define SMALL_STEP(scheme) scheme
#endif
#ifndef SMALL_INPUTS
#define SMALL_INPUTS(count) count
#endif
#ifndef SMALL_LOAD
#define SMALL_LOAD 0
#endif
#ifndef SMALL_SCALE
#define SMALL_SCALE common
#endif
#ifndef SMALL_LEARN
#define SMALL_LEARN networks
#endif
#ifndef SMALL_ROWS
#define SMALL_ROWS 0
#endif

#ifdef OF_ACTUATORS
#define ROLN_NAME SMALL(current) /* currents with learned gains, behind two layers */
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_ACTUATOR current
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(servo) /* positions that drives follow, behind a chart; damping */
#define ROLN_AE 5, 3, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_CHART polynomial, 2
#define ROLN_DAMPING 1
#define ROLN_ACTUATOR servo
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 5
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(winch) /* servos of two angles and a slider */
#define ROLN_AE 3
#define ROLN_MLP 4, 5
#define ROLN_ANGLES 1, 0, 1
#define ROLN_ACTUATOR servo
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 3
#define ROLN_INTEGRATOR SMALL_STEP(euler)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"
#elif defined OF_DRIVEN
#define ROLN_NAME SMALL(cart) /* one driven joint, exp(U) */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_DRIVEN 1
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(held) /* two driven joints, L L^T + floor I, damping */
#define ROLN_AE 4
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_DAMPING 1
#define ROLN_DRIVEN 2
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(euler)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(cable) /* two driven joints behind a chart */
#define ROLN_AE 6, 4
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 2
#define ROLN_DRIVEN 2
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#include "called.h"

#define ROLN_NAME SMALL(tied) /* one free angle; three driven joints, behind an SPD layer; friction */
#define ROLN_AE 4
#define ROLN_MLP 4
#define ROLN_LAYERS gyro
#define ROLN_ANGLES 1, 0, 1, 0
#define ROLN_FRICTION 1
#define ROLN_DRIVEN 3
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"
#else
#ifndef SMALL_DRIVEN_ONLY
#define ROLN_NAME SMALL(plain)
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SLOPE 0.4375
#define ROLN_HORIZON 4
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(bare) /* no autoencoder; base point, midpoint */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_INTEGRATOR SMALL_STEP(midpoint)
#define ROLN_BASE 1
#define ROLN_HORIZON 3
#define ROLN_BLOCK 1
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(square) /* a layer that keeps its size */
#define ROLN_AE 5, 3, 3
#define ROLN_MLP 3, 4, 3
#define ROLN_INTEGRATOR SMALL_STEP(euler)
#define ROLN_SLOPE 0.5
#define ROLN_BASE 1
#define ROLN_BLOCK 3
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(deep) /* the deepest */
#define ROLN_AE 10, 9, 8, 7, 6, 5, 4, 3, 2
#define ROLN_MLP 3, 2, 3, 2, 3
#define ROLN_SLOPE 0.625
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(pole) /* one degree of freedom, as linear as can be */
#define ROLN_AE 3, 1
#define ROLN_MLP 2
#define ROLN_INTEGRATOR SMALL_STEP(midpoint)
#define ROLN_SLOPE 1
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(delan) /* the mass matrix L L^T + least I of DeLaN */
#define ROLN_AE 4, 2
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_EIGENVALUE_FLOOR 0.0625
#define ROLN_INTEGRATOR SMALL_STEP(euler)
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(layered) /* as many SPD layers as there may be, no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 3
#define ROLN_LAYERS gyro, gyro, gyro, gyro
#define ROLN_DAMPING 1
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(chart) /* a chart of polynomials, and nothing else in the autoencoder */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 3
#define ROLN_HORIZON 3
#define ROLN_BLOCK 4
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(wheel) /* two angles and a slider between them, dry friction */
#define ROLN_AE 3
#define ROLN_MLP 4, 5
#define ROLN_ANGLES 1, 0, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(rubbed) /* a slider, an angle and a slider on servo drives in a fluid: law of friction, quadratic drag */
#define ROLN_AE 3
#define ROLN_MLP 4, 3
#define ROLN_ANGLES 0, 1, 0
#define ROLN_DAMPING 2
#define ROLN_FRICTION 2
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(bowl) /* polynomials behind a chart, a mass matrix of squares */
#define ROLN_AE 5, 2
#define ROLN_POLYNOMIALS 2, 3
#define ROLN_CHART polynomial, 2
#define ROLN_MASS squares, 3
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(gantry) /* polynomials of a slider and an angle: exp(U), damping, law of friction */
#define ROLN_AE 2
#define ROLN_POLYNOMIALS 2, 2
#define ROLN_ANGLES 0, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(laden) /* its filter estimates a load */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SLOPE 0.5
#define ROLN_LOAD 1
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"
#endif

/* with learned inputs */
#define ROLN_NAME SMALL(rich) /* everything at once */
#define ROLN_AE 6, 5, 3
#define ROLN_MLP 4, 3
#define ROLN_LAYERS gyro
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS SMALL_INPUTS(2)
#define ROLN_HORIZON 3
#define ROLN_PLAN 4, 2
#define ROLN_INTEGRATOR SMALL_STEP(rk4)
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(pushed) /* damping, midpoint; as many inputs as joints */
#define ROLN_AE 5, 2
#define ROLN_MLP 4, 3
#define ROLN_DAMPING 1
#define ROLN_INPUTS SMALL_INPUTS(5)
#define ROLN_INTEGRATOR SMALL_STEP(midpoint)
#define ROLN_HORIZON 2
#define ROLN_BLOCK 5
#define ROLN_PLAN 4, 5
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"

#define ROLN_NAME SMALL(curved) /* a chart behind a layer with an activation; inputs, midpoint */
#define ROLN_AE 6, 4, 3
#define ROLN_MLP 4, 3
#define ROLN_SLOPE 0.5
#define ROLN_CHART polynomial, 2
#define ROLN_INTEGRATOR SMALL_STEP(midpoint)
#define ROLN_INPUTS SMALL_INPUTS(2)
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#define ROLN_LOAD SMALL_LOAD
#define ROLN_SCALE SMALL_SCALE
#define ROLN_GN_ROWS SMALL_ROWS
#define ROLN_LEARN SMALL_LEARN
#include "called.h"
#endif

#undef SMALL
#undef SMALL_STEP
#undef SMALL_INPUTS
#undef SMALL_LOAD
#undef SMALL_SCALE
#undef SMALL_ROWS
#undef SMALL_LEARN
#undef SMALL_DRIVEN_ONLY
