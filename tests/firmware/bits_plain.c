/* SPDX-License-Identifier: MIT */
/* bits_plain.c - the kernels in plain C, for bits.c. */

#define ROLN_SIMD 0
#include "bits.h"

const struct kernels plain = KERNELS;
