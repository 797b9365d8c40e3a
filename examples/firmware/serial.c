/* SPDX-License-Identifier: MIT */
/* serial.c - a controller at the end of a serial line: state and reference come in frames (frame.h), torques go back. The machine
   may be a simulation: tests/control/pil.c runs MuJoCo's chain in lock step with this image.

   A tick begins with a new frame or, if none comes, at the deadline. Then the guard holds the last good torque, three ticks long;
   after that the torque is 0 until a frame arms again. What is damaged or cut off is no frame, a frame whose number is not new is
   not used, and numbers that were left out are bad ticks to the guard, too. Every tick is answered: a machine that gets no answer
   must stop its motors itself.

   pend16_weights.h is what train.c writes; `make firmware` makes it of a committed model. On hardware the line needs a buffer
   that DMA or an interrupt fills, unless, as here, the other side waits for the answer. */

#include "board.h"
#include "frame.h"
#include "pend16.h"
#include "pend16_weights.h"

/* From the beginning of a tick, in units of board_count: on hardware the cycles of one and a half ticks. In QEMU, where the other
   side's time is not ours, long enough for any pause of a busy PC. */
#ifndef DEADLINE
#define DEADLINE 20000000
#endif
#define TICK 0.001f /* s */
enum { N = pend16_N, n = pend16_n, SIZE = FRAME_SIZE(N, n), ANSWER = FRAME_ANSWER(N) };

/* s, range seen in training and 5 %, W, N m, bad ticks that are bridged, rad and rad/s off the manifold. */
static const roln_limits limits = {
    .dt = TICK, .margin = 0.05f, .residual = 3, .tau = 60, .hold = 3, .q_tolerance = 0.05f, .qd_tolerance = 1};

static struct {
    pend16_state x; /* of the last frame */
    pend16_latent s;
    pend16_target ref;  /* and gains */
    pend16_guard guard; /* guard.tau: the answer */
    pend16_work work;
} ctl;

static struct {
    uint8_t bytes[SIZE];
    int have;         /* bytes of what may become a frame */
    int armed;
    uint32_t last;    /* number of the last frame used */
    uint32_t missed;  /* deadlines since */
    uint32_t began;   /* board_count at the beginning of the last tick */
    uint32_t faults;  /* LINK_.. since the last answer */
    uint32_t all;     /* and since armed */
} line;

/* One byte more; nonzero: line.bytes is a frame. What cannot begin one is dropped: nothing before a frame costs the frame. */
static int take(uint8_t byte)
{
    int i = 0;
    line.bytes[line.have++] = byte;
    while (i < line.have && !frame_begins(SIZE, line.have - i, line.bytes + i))
        i++;
    if (i > 0) {
        line.faults |= LINK_NOISE;
        line.have -= i;
        memmove(line.bytes, line.bytes + i, (size_t)line.have);
    }
    if (line.have < SIZE) return 0;
    line.have = 0;
    return 1;
}

/* Waits for a new frame: its letter, or 0 at the deadline. */
static uint8_t await(void)
{
    for (;;) {
        const int byte = board_poll();
        if (byte >= 0 && take((uint8_t)byte)) {
            const uint8_t letter = line.bytes[3];
            const int later = (int32_t)(frame_get(line.bytes, 1) - line.last) > 0;
            if (line.armed ? later && (letter == 't' || letter == 'a') : letter == 'a') return letter;
            line.faults |= LINK_OLD;
        }
        if (line.armed && board_count() - line.began >= DEADLINE) return 0;
    }
}

static void arm(void)
{
    memset(&ctl, 0, sizeof ctl);
    frame_get_floats(line.bytes, 2, n, ctl.ref.kp);
    frame_get_floats(line.bytes, 2 + n, n, ctl.ref.kd);
    line.armed = 1;
    line.all = 0;
}

/* One tick, of line.bytes or without a frame: ctl.guard.tau out whatever happens. Returns the faults. */
static uint32_t control_tick(int frame)
{
    if (!frame) return pend16_guard_tick(&pend16_weights, &limits, &ctl.x, &ctl.s, NULL, &ctl.guard, &ctl.work.guard_tick);
    frame_get_floats(line.bytes, 2, N, ctl.x.q);
    frame_get_floats(line.bytes, 2 + N, N, ctl.x.qd);
    frame_get_floats(line.bytes, 2 + 2 * N, n, ctl.ref.z);
    frame_get_floats(line.bytes, 2 + 2 * N + n, n, ctl.ref.zd);
    frame_get_floats(line.bytes, 2 + 2 * N + 2 * n, n, ctl.ref.zdd);
    return pend16_tick(&pend16_weights, &limits, &ctl.x, &ctl.ref, &ctl.s, &ctl.guard, &ctl.work.tick);
}

static void answer(uint32_t faults, uint32_t used)
{
    uint8_t bytes[ANSWER];
    line.all |= line.faults;
    memcpy(bytes, FRAME_START "t", 4);
    frame_put(bytes, 1, line.last);
    frame_put(bytes, 2, faults | line.faults);
    frame_put(bytes, 3, ctl.guard.g.faults | line.all);
    frame_put(bytes, 4, used);
    frame_put_floats(bytes, 5, N, ctl.guard.tau);
    frame_seal(ANSWER, bytes);
    for (int i = 0; i < ANSWER; i++)
        board_put(bytes[i]);
    line.faults = 0;
}

int main(void)
{
    answer(0, 0); /* we are up; nothing is armed */
    for (;;) {
        const uint8_t letter = await();
        uint32_t faults = 0;
        line.began = board_count();
        if (letter == 0) {
            line.faults |= LINK_NONE;
            line.missed++;
            faults = control_tick(0);
        } else {
            const uint32_t number = frame_get(line.bytes, 1);
            if (letter == 'a')
                arm();
            else {
                const int32_t gap = (int32_t)(number - line.last - 1 - line.missed);
                if (gap > 0) line.faults |= LINK_GAP;
                for (int k = 0; k < gap && k <= limits.hold; k++) /* no more than it takes to expire */
                    control_tick(0);
                faults = control_tick(1);
            }
            line.last = number;
            line.missed = 0;
        }
        answer(faults, board_count() - line.began);
    }
}
