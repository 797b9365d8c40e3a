/* SPDX-License-Identifier: MIT */
/* constants.h - what users do with the constants of roln, without a cast, in every C and C++: warnings.sh compiles it. Bits of the
   guard with bits of the filter and with bits of their own, sizes with reals and with sizes of another model, array lengths,
   cases, conditions of the preprocessor. */
#ifndef CONSTANTS_H
#define CONSTANTS_H

#include "models.h"

enum { MY_STALE = 1 << 16, MY_STOP = 1 << 17 };
enum { MY_ROWS = 3 };

#if ROLN_FILTER_NONE <= ROLN_CLIPPED || ROLN_FAULT_INPUT != 1
#error "a bit of the filter is one of the guard"
#endif

static uint32_t constants_bits(uint32_t faults, int stop)
{
    const uint32_t none = ROLN_FILTER_NONE | ROLN_FAULT_STATUS | ROLN_CLIPPED | MY_STALE;
    if (faults & (ROLN_FILTER_NONE | ROLN_FAULT_STATUS)) faults |= stop ? ROLN_FAULT_EXPIRED : ROLN_FILTER_MISSING;
    if (faults == (stop ? ROLN_FAULT_RANGE : ROLN_FILTER_START)) return ROLN_FAULT_RANGE | ROLN_FILTER_START;
    faults = (faults & ~ROLN_FILTER_START) ^ (ROLN_FAULT_LIMIT + ROLN_FILTER_OUTLIER);
    switch (faults) {
    case ROLN_FAULT_INPUT: return MY_STOP | ROLN_FAULT_INPUT;
    case ROLN_FAULT_STATUS | ROLN_FILTER_NONE: return 1;
    case ROLN_CLIPPED: return 2;
    default: return faults & ~none;
    }
}

static roln_real constants_sizes(const roln_real *x, int count)
{
    roln_real both[small_N + delan_N * MY_ROWS] = {0};
    const int all = layered_N + delan_n * wheels_n - modes_N / chart_n;
    roln_real sum = 0, mean;
    int i;
    for (i = 0; i < small_N + delan_N * MY_ROWS; i++)
        both[i] = x[i] + ROLN_C(0.5) * chart_n;
    for (i = 0; i < small_N; i++)
        sum += both[i];
    mean = sum / small_N + 1 / ROLN_C(2.0) * layered_theta_size;
    if (mean > small_N || count == (all > 0 ? small_n : delan_N) || count < delan_blocks) mean -= layered_newton_blocks;
    switch (count) {
    case small_N + layered_N: return mean;
    default: return sum;
    }
}

int main(void)
{
    const roln_real x[small_N + delan_N * MY_ROWS] = {0};
    return constants_bits(0, 1) == 2 && constants_sizes(x, 0) > 0;
}

#endif
