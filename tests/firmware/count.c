/* SPDX-License-Identifier: MIT */
/* count.c - the instruction counter is exact: loops of known numbers of instructions, counted with what the reading costs taken
   off; short ones, one that lets the timer behind it wrap around more than once, and 1000 in a row whose sum must agree. */
#include "text.h"

/* 2 n instructions. */
__attribute__((noipa)) static uint32_t loop(uint32_t n)
{
    const uint32_t before = board_count();
#ifdef __arm__
    __asm volatile("1: subs %0, #1\n bne 1b" : "+r"(n)::"cc");
#else
    __asm volatile("1: addi %0, %0, -1\n bnez %0, 1b" : "+r"(n));
#endif
    return board_count() - before;
}

static uint32_t instructions(uint32_t n)
{
    return loop(n) - (loop(1) - 2);
}

int main(void)
{
    static const uint32_t n[] = {1, 2, 3, 10, 100, 1000, 12345, 1000000, 5000000};
    int bad = 0;
    loop(1);
    for (unsigned i = 0; i < sizeof n / sizeof *n; i++) {
        const uint32_t counted = instructions(n[i]);
        put_integer(2 * n[i], 10);
        put_integer(counted, 10);
        put_text(counted == 2 * n[i] ? "\n" : " wrong\n");
        bad |= counted != 2 * n[i];
    }
    uint32_t sum = 0;
    for (uint32_t i = 1; i <= 1000; i++)
        sum += instructions(i * 7);
    put_integer(1001 * 1000 * 7, 10);
    put_integer(sum, 10);
    put_text(sum == 1001 * 1000 * 7 ? "\n" : " wrong\n");
    return bad | (sum != 1001 * 1000 * 7);
}
