/* SPDX-License-Identifier: MIT */
/* uart_16550.c - a 16550, byte by byte, and the reset of QEMU's virt; where they are: symbols of virt.ld. RISC-V knows no reset of
   the chip: yours has a register, or a watchdog. */

#include "board.h"

extern volatile uint8_t uart[8]; /* 0 data, 3 line control, 5 line status */
extern volatile uint32_t finisher;

void board_start(void)
{
    uart[3] = 3; /* 8 bits; the baud rate stays as the boot loader left it */
}

void board_put(uint8_t byte)
{
    while (!(uart[5] & 0x20)) /* transmit buffer full */
        ;
    uart[0] = byte;
}

int board_poll(void)
{
    return uart[5] & 1 ? uart[0] : -1; /* receive buffer full */
}

uint8_t board_get(void)
{
    int byte;
    while ((byte = board_poll()) < 0)
        ;
    return (uint8_t)byte;
}

void board_reset(void)
{
    finisher = 0x7777;
    for (;;)
        ;
}
