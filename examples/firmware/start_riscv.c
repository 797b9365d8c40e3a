/* SPDX-License-Identifier: MIT */
/* start_riscv.c - RV32 with F, machine mode: from reset to main, traps. */

#include "board.h"
#include "text.h"

extern const uint32_t data_image[];
extern uint32_t data_start[], data_end[], bss_start[], bss_end[];
int main(void);
void start(void);
void trap(void);
void start_memory(void);
void trap_report(uint32_t cause, uint32_t pc);

/* Reset: pointers, where traps go, floating-point unit on (mstatus.FS), nearest rounding. Trap: a fresh stack, then report. */
__attribute__((section(".vectors"), naked, used)) void start(void)
{
    __asm volatile(".option push\n .option norelax\n la gp, __global_pointer$\n .option pop\n"
                   "la sp, stack_top\n la t0, trap\n csrw mtvec, t0\n"
                   "li t0, 1 << 13\n csrs mstatus, t0\n csrw fcsr, zero\n"
                   "j start_memory");
}

__attribute__((naked, used, aligned(4))) void trap(void)
{
    __asm volatile("csrr a0, mcause\n csrr a1, mepc\n la sp, stack_top\n j trap_report");
}

__attribute__((used)) void start_memory(void)
{
    const uint32_t *from = data_image;
    for (uint32_t *to = data_start; to < data_end; to++)
        *to = *from++;
    for (uint32_t *to = bss_start; to < bss_end; to++)
        *to = 0;
    board_start();
    board_exit(main());
}

__attribute__((used)) void trap_report(uint32_t cause, uint32_t pc)
{
    board_safe();
    put_text("\nfault ");
    put_integer(cause, 0);
    put_text(" at 0x");
    put_hex(pc, 8);
    put_text("\n");
    board_exit(255);
}

/* What an image has without emulator.c and without functions of its own. */
__attribute__((weak)) void board_safe(void) {}

__attribute__((weak)) void board_exit(int code)
{
    (void)code;
    for (;;)
        ;
}

/* mcycle */
__attribute__((weak)) uint32_t board_count(void)
{
    uint32_t count;
    __asm volatile("csrr %0, mcycle" : "=r"(count));
    return count;
}
