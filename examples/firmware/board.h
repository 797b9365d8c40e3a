/* SPDX-License-Identifier: MIT */
/* board.h - all that the images of this directory know about the machine. Files that implement it:

   NAME.ld           memory, address of the UART: one file a board        start_arm.c, start_riscv.c   from reset to main, faults
   sections.ld       what goes where, the same for all                     uart_cmsdk.c, uart_16550.c   bytes in and out
   emulator.c        exit code and instruction counter of QEMU. On hardware leave it out of cc.sh: board_exit then stops, and
                     board_count counts cycles (start_arm.c, start_riscv.c).
   host.c            the same on a PC

   For another board copy NAME.ld and change its numbers; for another UART write the functions of uart_cmsdk.c. */
#ifndef BOARD_H
#define BOARD_H

#include <stdint.h>

void board_start(void);         /* UART on; called before main */
void board_put(uint8_t byte);   /* waits until the UART takes it */
int board_poll(void);           /* a byte, or -1: none has come */
uint8_t board_get(void);        /* waits for a byte */
uint32_t board_count(void);     /* instructions since some moment, modulo 2^32; without emulator.c cycles */
void board_reset(void);         /* reset of the whole chip; memory in KEPT stays */
void board_exit(int code);      /* the end of the program: main returned, or a fault (code 255) */
void board_safe(void);          /* first call after a fault: motors off. Does nothing unless you define it */

/* A variable that start-up leaves alone: it survives a reset, not the loss of power, so check it before use. */
#ifdef __ELF__
#define KEPT __attribute__((section(".kept")))
#else
#define KEPT
#endif

#endif
