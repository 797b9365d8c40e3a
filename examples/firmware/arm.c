/* SPDX-License-Identifier: MIT */
/* arm.c - the controller of examples/arm.c at the end of a serial line: counts of six encoders and the reference q, qd, qdd come in
   frames (line.h), torques in Nm go back. tests/control/machines.c leads MuJoCo's arm with it, in lock step. */

#include "arm_tick.h"
#include "line.h"

enum { N = arm_N, SIZE = 4 * (2 + 4 * N + 1) };

static controller ctl;

/* A fault of the processor ends here first (board.h). */
void board_safe(void)
{
    memset(ctl.guard.tau, 0, sizeof ctl.guard.tau);
}

int main(void)
{
    uint8_t frame[SIZE] = FRAME_START "t";
    line_answer(frame, 0, 0, N, ctl.guard.tau); /* we are up */
    for (;;) {
        int count[N];
        roln_real ref[3 * N];
        line_take(SIZE, frame);
        for (int i = 0; i < N; i++)
            count[i] = (int)frame_get(frame, 2 + i);
        frame_get_floats(frame, 2 + N, 3 * N, ref);
        const uint32_t began = board_count(), faults = controller_tick(&ctl, count, ref, ref + N, ref + 2 * N);
        line_answer(frame, faults, board_count() - began, N, ctl.guard.tau);
    }
}
