/* SPDX-License-Identifier: MIT */
/* emulator.c - what only QEMU has: an exit code, through semihosting, and a counter of instructions.

   Under -icount shift=8 every instruction takes 256 ns of the virtual clock. SysTick runs on that clock with `clock` Hz, several
   ticks per instruction, so its value tells their number exactly (tests/firmware/count.c). Its wrap-around every 2^24 ticks costs
   an interrupt, whose instructions are taken off again. RISC-V counts by itself. */

#include "board.h"

#ifdef __arm__

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYSTICK_CONTROL REGISTER(0xe000e010)
#define SYSTICK_RELOAD REGISTER(0xe000e014)
#define SYSTICK_VALUE REGISTER(0xe000e018)
#define ICSR REGISTER(0xe000ed04) /* bit 26: the interrupt is pending */

extern const uint8_t count_scale[]; /* instructions per tick, times 2^32 */
volatile uint32_t systick_wraps;
void systick(void);

/* Five instructions. */
__attribute__((naked)) void systick(void)
{
    __asm volatile("ldr r0, =systick_wraps\n ldr r1, [r0]\n adds r1, #1\n str r1, [r0]\n bx lr");
}

uint32_t board_count(void)
{
    uint32_t wraps, value, handled;
    if (!(SYSTICK_CONTROL & 1)) {
        SYSTICK_RELOAD = 0xffffff;
        SYSTICK_VALUE = 0;
        SYSTICK_CONTROL = 7; /* processor clock, interrupt, on */
    }
    __asm volatile("cpsid i" ::: "memory");
    value = SYSTICK_VALUE;
    handled = systick_wraps, wraps = handled + (ICSR >> 26 & value >> 23 & 1);
    __asm volatile("cpsie i" ::: "memory");
    const uint64_t ticks = ((uint64_t)wraps << 24) + (0xffffff - value), scale = (uintptr_t)count_scale;
    return (uint32_t)((ticks >> 32) * scale + (((ticks & 0xffffffff) * scale + 0x80000000) >> 32)) - 5 * handled;
}

static void semihosting(uint32_t what, const void *with)
{
    register uint32_t r0 __asm("r0") = what;
    register const void *r1 __asm("r1") = with;
    __asm volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
}

#else

uint32_t board_count(void)
{
    uint32_t count;
    __asm volatile("csrr %0, minstret" : "=r"(count));
    return count;
}

static void semihosting(uint32_t what, const void *with)
{
    register uint32_t a0 __asm("a0") = what;
    register const void *a1 __asm("a1") = with;
    __asm volatile(".balign 16\n .option push\n .option norvc\n slli zero, zero, 0x1f\n ebreak\n srai zero, zero, 7\n .option pop"
                   : "+r"(a0) : "r"(a1) : "memory");
}

#endif

void board_exit(int code)
{
    const uint32_t reason[2] = {0x20026, (uint32_t)code}; /* application exit */
    semihosting(0x20, reason);                            /* SYS_EXIT_EXTENDED */
    for (;;)
        ;
}
