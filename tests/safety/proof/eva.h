/* SPDX-License-Identifier: MIT */
/* eva.h - what Frama-C Eva is told of functions that work on the bits of a float, which it does not relate to its value. proof.sh
   gives it copies of the headers in which the definitions of these functions have other names (.._bits); lemma.c compares the two
   on all 2^32 floats. */
#ifndef EVA_H
#define EVA_H

#include <math.h>
#include <stdint.h>
#include <string.h>

#define EVA_MOST 0x1.fffffep127f /* the largest float */

/* |x|; of 0 the sign may differ. */
#define EVA_ABS(x) ((x) < 0 ? -(x) : (x))

static int roln_finite(float x)
{
    if (!(-EVA_MOST <= x && x <= EVA_MOST)) return 0;
    /*@ admit finite: \is_finite(x); */ /* a comparison is true: no NaN, which Eva does not conclude */
    return 1;
}

static int rolni_is_angle(float x)
{
    if (!(-0x1p20f <= x && x <= 0x1p20f)) return 0;
    /*@ admit finite: \is_finite(x); */
    return 1;
}

/*@ assigns \result \from x;
    ensures positive: \is_NaN(\result) || 0 <= \result; */
static float rolni_exp(float x);

/*@ assigns \result \from x; */
static float roln_expm1(float x);

#ifdef __FRAMAC__
#include "__fc_builtin.h"
#define fabsf(x) EVA_ABS(x)
#define __builtin_memcpy memcpy
#define EVA_ANY(x) Frama_C_make_unknown((char *)&(x), sizeof (x)) /* any bits */

/* What guard.c and tick.c assert of a torque. */
static void may_go_to_a_motor(float tau, float limit)
{
    /*@ assert finite: \is_finite(tau); */
    /*@ assert within: -limit <= tau <= limit; */
    (void)tau, (void)limit;
}
#endif

#endif
