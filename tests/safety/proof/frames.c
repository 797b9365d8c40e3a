/* SPDX-License-Identifier: MIT */
/* frames.c - whatever bytes come from the line, at whatever time, examples/firmware/serial.c does nothing undefined. Its invariant,
   0 <= line.have < SIZE, holds at the start. main: `take` keeps it, any bytes and each line.have.
   serial_main: with that, any letters, deadlines and numbers in all ticks. The tick itself leaves any bits here. */

#include "eva.h"
#include "board.h"
#include "pend16.h"

static const pend16_params pend16_weights;
static volatile int any;

int board_poll(void)
{
    return any;
}

uint32_t board_count(void)
{
    return (uint32_t)any;
}

void board_put(uint8_t byte)
{
    (void)byte;
}

static uint32_t any_tick(pend16_guard *guard)
{
    EVA_ANY(*guard);
    return (uint32_t)any;
}

/* Of a frame that armed and one behind it: the loop runs. proof.sh asks for this assertion. */
static uint32_t tick_of_frame(pend16_guard *guard)
{
    /*@ assert used: \true; */
    return any_tick(guard);
}

#define pend16_tick(p, limits, x, ref, s, guard, work) tick_of_frame(guard)
#define pend16_guard_tick(p, limits, x, s, want, guard, work) any_tick(guard)
#define main serial_main
#include "serial.c"
#undef main

/*@ requires have: 0 <= line.have < SIZE;
    assigns line, \result \from line, byte;
    ensures have: 0 <= line.have < SIZE; */
static int take(uint8_t byte);

int main(void)
{
    int have;
    for (have = 0; have < SIZE; have++) {
        EVA_ANY(line);
        line.have = have;
        take((uint8_t)any);
        /*@ assert have: 0 <= line.have < SIZE; */
    }
    /*@ assert ended: \true; */
    return 0;
}
