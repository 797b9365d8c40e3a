/* SPDX-License-Identifier: MIT */
/* furuta.c - the controller of examples/furuta.c at the end of a serial line: counts of two encoders come in frames (line.h), a
   torque goes back. tests/control/machines.c runs MuJoCo's pendulum with it, in lock step. */

#include "furuta_tick.h"
#include "line.h"

enum { SIZE = 4 * (2 + 2 + 1) };

static controller ctl;

/* A fault of the processor ends here first (board.h). */
void board_safe(void)
{
    ctl.guard.tau[0] = 0;
}

int main(void)
{
    uint8_t frame[SIZE] = FRAME_START "t";
    if (controller_start(&ctl) != ROLN_OK) return 1;
    line_answer(frame, 0, 0, 1, ctl.guard.tau); /* we are up */
    for (;;) {
        line_take(SIZE, frame);
        const int count[2] = {(int)frame_get(frame, 2), (int)frame_get(frame, 3)};
        const uint32_t began = board_count(), faults = controller_tick(&ctl, count);
        line_answer(frame, faults, board_count() - began, 1, ctl.guard.tau);
    }
}
