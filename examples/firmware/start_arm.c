/* SPDX-License-Identifier: MIT */
/* start_arm.c - Cortex-M4F, M7, M33, M55: vector table, from reset to main, faults. */

#include "board.h"
#include "text.h"

extern const uint32_t data_image[];
extern uint32_t stack_bottom[], stack_top[], data_start[], data_end[], bss_start[], bss_end[];
int main(void);
void start(void);
void fault(void);
void fault_report(uint32_t exception, const uint32_t *frame);
__attribute__((weak)) void systick(void); /* 0, and a fault if it is called, unless somebody defines it */

#define REGISTER(address) (*(volatile uint32_t *)(address))

/* The interrupts of the chip follow behind the last entry, in the order of its manual. */
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t *stack;
    void (*entry[15])(void);
} vectors = {stack_top, {start, fault, fault, fault, fault, fault, fault, 0, 0, 0, fault, fault, 0, fault, systick}};

void start(void)
{
    const uint32_t *from = data_image;
    REGISTER(0xe000ed88) |= UINT32_C(0xf) << 20; /* CPACR: floating-point unit on */
    __asm volatile("dsb\n isb" ::: "memory");
    for (uint32_t *to = data_start; to < data_end; to++)
        *to = *from++;
    for (uint32_t *to = bss_start; to < bss_end; to++)
        *to = 0;
    board_start();
    board_exit(main());
}

/* Every fault, the stack being full perhaps: take a fresh one, then report. */
__attribute__((naked)) void fault(void)
{
    __asm volatile("cpsid i\n mrs r0, ipsr\n mrs r1, msp\n ldr r2, =stack_top\n msr msp, r2\n b fault_report");
}

__attribute__((used)) void fault_report(uint32_t exception, const uint32_t *frame)
{
    board_safe();
    put_text("\nfault ");
    put_integer(exception, 0);
    if (frame >= stack_bottom && frame + 8 <= stack_top) {
        put_text(" at 0x");
        put_hex(frame[6], 8);
    }
    put_text("\n");
    board_exit(255);
}

/* SYSRESETREQ */
void board_reset(void)
{
    REGISTER(0xe000ed0c) = UINT32_C(0x05fa0004);
    for (;;)
        ;
}

/* What an image has without emulator.c and without functions of its own. */
__attribute__((weak)) void board_safe(void) {}

__attribute__((weak)) void board_exit(int code)
{
    (void)code;
    for (;;)
        ;
}

/* DWT: cycles */
__attribute__((weak)) uint32_t board_count(void)
{
    REGISTER(0xe000edfc) |= UINT32_C(1) << 24;
    REGISTER(0xe0001000) |= 1;
    return REGISTER(0xe0001004);
}
