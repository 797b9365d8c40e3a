/* SPDX-License-Identifier: MIT */
/* floats.h - the functions of one float (floats.c). */
#ifndef FLOATS_H
#define FLOATS_H

/* Of the activation of the encoder value, slope, curvature. */
enum { EXP, EXPM1, LOG, LOG1P, SINHC, SOFTPLUS, SIGMOID, TANH, SQRT, SIN, COS, WRAP, VALUE, RISE, CURVE, FUNCTIONS };

#define SLOPE 0.41421356f /* of the activation: the default */

void reference(int f, int count, const float *x, double *y);

#endif
