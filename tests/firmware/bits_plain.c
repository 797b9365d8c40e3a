/* SPDX-License-Identifier: MIT */
/* bits_plain.c - the kernels in plain C, for bits.c. */

#define ROLN_SIMD 0
#define ROLN_WEIGHTS_EXTERN
#include "bits.h"

const struct kernels plain = KERNELS;
