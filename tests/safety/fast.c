/* SPDX-License-Identifier: MIT */
/* fast.c - finite checks of a program that was compiled with -ffast-math (fast.sh), and so was told that there is no NaN: numbers
   that are none, here as bits, do not get past the guard and the packed bytes. */

#include <stdio.h>
#include "chain.h"
#include "chain_weights.h"

#define EXPONENT UINT32_C(0x7f800000)
#define SIGN UINT32_C(0x80000000)

static const roln_limits limits = {
    .dt = ROLN_C(0.005), .margin = 1000, .tau = 2, .hold = 1, .q_tolerance = 1000, .qd_tolerance = 1000, .residual = 1000};
static chain_params params, back;
static chain_guard guard;
static chain_latent s;
static chain_target target;
static chain_state x;
static chain_work work;
static unsigned char bytes[chain_packed_size];
static roln_real want[chain_N];
static int passed, failed;

static void check(int is, const char *what)
{
    if (is) passed++;
    else failed++, printf("failed: %s\n", what);
}

static void put(roln_bits bits, roln_real *to)
{
    memcpy(to, &bits, sizeof bits);
}

/* Nonzero if each torque is within its limit, by bits, for nothing else says here what a number is: magnitudes are in the order of
   theirs. */
static int within(void)
{
    roln_bits b, top;
    int i, good = 1;
    memcpy(&top, &limits.tau, sizeof top);
    for (i = 0; i < chain_N; i++) {
        memcpy(&b, guard.tau + i, sizeof b);
        good &= (b & ~SIGN) <= top;
    }
    return good;
}

static void start(void)
{
    memset(&guard, 0, sizeof guard), memset(&x, 0, sizeof x), memset(want, 0, sizeof want);
}

static void none(roln_bits bits)
{
    roln_real number;
    int i;
    put(bits, &number);
    check(!roln_finite(number) && !roln_all_finite(1, &number), "roln_finite");
    start(), put(bits, x.q + 3);
    check((chain_tick(&params, &limits, &x, &target, &s, &guard, &work.tick) & ROLN_FAULT_INPUT) != 0 && within(), "q");
    start(), put(bits, x.qd + chain_N - 1);
    check((chain_tick(&params, &limits, &x, &target, &s, &guard, &work.tick) & ROLN_FAULT_INPUT) != 0 && within(), "qd");
    start(), put(bits, want + 2);
    check((chain_guard_tick(&params, &limits, &x, &s, want, &guard, &work.guard_tick) & ROLN_FAULT_OUTPUT) != 0 && within(),
          "torque");
    start();
    for (i = 0; i < chain_N; i++)
        put(bits, guard.tau + i);
    check((chain_guard_tick(&params, &limits, &x, NULL, NULL, &guard, &work.guard_tick) & ROLN_FAULT_STATUS) != 0 && within(),
          "held");
    back = params, put(bits, back.theta + chain_theta_size - 1);
    chain_pack(&back, bytes);
    check(chain_unpack(sizeof bytes, bytes, &back) == ROLN_E_NOT_FINITE, "packed");
}

int main(void)
{
    params = chain_weights;
    check(roln_finite(1) && roln_finite(0), "what is finite");
    none(EXPONENT), none(EXPONENT | SIGN), none(EXPONENT | EXPONENT >> 1), none(EXPONENT | 1), none(EXPONENT | SIGN | 1);
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0;
}
