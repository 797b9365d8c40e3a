/* SPDX-License-Identifier: MIT */
/* resets.c - linked to adapt.c with -Wl,--wrap=board_count: every 251st call, which is before or after a tick, resets the
   chip: in less than two turns. */
#include "board.h"

uint32_t __real_board_count(void);
uint32_t __wrap_board_count(void);

uint32_t __wrap_board_count(void)
{
    static uint32_t calls KEPT;
    if (++calls % 251 == 0) board_reset();
    return __real_board_count();
}
