/* SPDX-License-Identifier: MIT */
/* host.c - the board that is a PC: standard input and output. */

#include <stdio.h>
#include <stdlib.h>
#include "board.h"

void board_start(void) {}

void board_put(uint8_t byte)
{
    putchar(byte);
}

int board_poll(void)
{
    return board_get(); /* a PC waits */
}

uint8_t board_get(void)
{
    fflush(stdout);
    const int byte = getchar();
    if (byte == EOF) exit(255);
    return (uint8_t)byte;
}

uint32_t board_count(void)
{
    return 0;
}

void board_exit(int code)
{
    exit(code);
}

void board_reset(void)
{
    exit(254);
}
