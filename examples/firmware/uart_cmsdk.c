/* SPDX-License-Identifier: MIT */
/* uart_cmsdk.c - the UART of Arm's MPS2 and MPS3 boards; where it is: symbol `uart` of the board's .ld file. */

#include "board.h"

extern volatile struct {
    uint32_t data, state, control, interrupt, divider;
} uart;

void board_start(void)
{
    uart.divider = 217; /* 115200 baud at 25 MHz */
    uart.control = 3;   /* transmit, receive */
}

void board_put(uint8_t byte)
{
    while (uart.state & 1) /* transmit buffer full */
        ;
    uart.data = byte;
}

int board_poll(void)
{
    return uart.state & 2 ? (int)(uart.data & 0xff) : -1; /* receive buffer full */
}

uint8_t board_get(void)
{
    int byte;
    while ((byte = board_poll()) < 0)
        ;
    return (uint8_t)byte;
}
