/* SPDX-License-Identifier: MIT */
/* lemma.c - the statements of eva.h on all 2^32 floats; lemma sample: of those about roln_exp and roln_expm1 on every 251st.
   Compiled with the sanitizer of undefined behaviour, under which what is not defined ends the program: so all is defined there. */

#include <stdio.h>
#include "eva.h"
#include "roln.h"

static float rolni_exp(float x)
{
    return rolni_exp_bits(x);
}

static float roln_expm1(float x)
{
    return rolni_expm1_bits(x);
}

static float number(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

int main(int count, char **words)
{
    const uint32_t stride = count > 1 && strcmp(words[1], "sample") == 0 ? 251 : 1;
    uint32_t bits = 0, last;
    long wrong[5] = {0, 0, 0, 0, 0};
    int i, failed = 0;
    do {
        const float x = number(bits);
        wrong[0] += roln_finite(x) != rolni_finite_bits(x) || !roln_finite(x) != !isfinite(x);
        wrong[1] += !(fabsf(x) == EVA_ABS(x)) & (x == x);
        wrong[2] += !rolni_is_angle(x) != !rolni_is_angle_bits(x);
    } while (++bits != 0);
    do {
        const float x = number(bits), e = rolni_exp(x), f = roln_expm1(x);
        wrong[3] += (e != e) != (x != x) || e < 0;
        wrong[4] += (f != f) != (x != x);
        last = bits, bits += stride;
    } while (bits > last);
    for (i = 0; i < 5; i++)
        failed += wrong[i] > 0;
    printf("wrong: roln_finite %ld, fabsf %ld, rolni_is_angle %ld of all floats, ", wrong[0], wrong[1], wrong[2]);
    printf("roln_exp %ld, roln_expm1 %ld of each %u.\n", wrong[3], wrong[4], (unsigned)stride);
    printf("%d passed, %d failed\n", 5 - failed, failed);
    return failed > 0;
}
