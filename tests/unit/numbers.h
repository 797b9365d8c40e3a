/* SPDX-License-Identifier: MIT */
/* numbers.h - numbers that are the same in float and in double, arrays of numbers compared, scratch that is not tested. Include
   after twin.h and room.h. */
#ifndef NUMBERS_H
#define NUMBERS_H

/* The room of the function that was called last has not been left. */
#define ROOM_KEPT() CHECK_BELOW(room_used(), room_end)

static roln_real spare[20000]; /* where scratch is not what is tested */

/* 16-bit dyadic numbers in +-size: the same in float and in double */
ROLN_FN void dyadic(int n, roln_real size, uint64_t *s, roln_real *x)
{
    while (n-- > 0)
        *x++ = size * ((roln_real)roln_randint(65536, s) - 32768) * ROLN_C(0.000030517578125);
}

ROLN_FN void fill(int n, roln_real value, roln_real *x)
{
    while (n-- > 0)
        *x++ = value;
}

/* Are the n numbers at x all `value`, which is not NaN? */
ROLN_FN int all(int n, const roln_real *x, roln_real value)
{
    int i, ok = 1;
    for (i = 0; i < n; i++)
        ok &= x[i] <= value && x[i] >= value;
    return ok;
}

ROLN_FN ld largest(int n, const roln_real *x)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl((ld)x[i]) > top ? fabsl((ld)x[i]) : top;
    return top;
}

ROLN_FN ld furthest(int n, const roln_real *x, const roln_real *y)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl((ld)x[i] - (ld)y[i]) > top ? fabsl((ld)x[i] - (ld)y[i]) : top;
    return top;
}

#endif
