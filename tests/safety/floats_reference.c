/* SPDX-License-Identifier: MIT */
/* floats_reference.c - floats.c: the functions in double, of n finite floats, where the result is finite in double. Compiled with
   -ffast-math, for then gcc takes four at a time from libmvec, whose error is 4 ulp of a double: nothing beside half an ulp of a
   float. */
#include "floats.h"

#include <math.h>

#define EACH(expression) \
    for (i = 0; i < count; i++) { \
        const double v = (double)x[i]; \
        y[i] = expression; \
    }

static double size(double v)
{
    return v < 0 ? -v : v;
}

static double most(double v, double end)
{
    return v < end ? v : end;
}

/* The activation of the encoder and its derivatives, in the form of rolni_act. */
static void knee(int f, int count, const float *x, double *y)
{
    const double k = (double)SLOPE, q = 1 + k * k, w = sqrt(q), k1 = q / (2 * k), e = k / q;
    const double k2 = (1 - k * k) / (2 * k), c = (1 - k) / (2 * w), r0 = (1 + k) / (2 * w);
    int i;
    switch (f) {
    case VALUE: EACH(v * (k1 - k2 * (v + c + c) / (sqrt((v + c) * (v + c) + e) + r0))) break;
    case RISE: EACH(k1 - k2 * (v + c) / sqrt((v + c) * (v + c) + e)) break;
    default: EACH(-k2 * e / (((v + c) * (v + c) + e) * sqrt((v + c) * (v + c) + e)))
    }
}

void reference(int f, int count, const float *x, double *y)
{
    const double turn = 6.283185307179586477;
    int i;
    switch (f) {
    case EXP: EACH(exp(most(v, 200))) break;
    case EXPM1: EACH(expm1(most(v, 200))) break;
    case LOG: EACH(log(v)) break;
    case LOG1P: EACH(log1p(v)) break;
    case SINHC: EACH(sinh(most(size(v), 200)) / most(size(v), 200)) break;
    case SOFTPLUS: EACH(v > 0 ? v + log1p(exp(-v)) : log1p(exp(v))) break;
    case SIGMOID: EACH((v < 0 ? exp(-size(v)) : 1) / (1 + exp(-size(v)))) break;
    case TANH: EACH(tanh(v)) break;
    case SQRT: EACH(sqrt(v)) break;
    case SIN: EACH(sin(v)) break;
    case COS: EACH(cos(v)) break;
    case WRAP: EACH(v - turn * rint(v / turn)) break;
    default: knee(f, count, x, y);
    }
}
