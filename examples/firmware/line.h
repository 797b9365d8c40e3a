/* SPDX-License-Identifier: MIT */
/* line.h - a frame in, an answer out, in lock step, for images that do nothing without a frame: "rolt", number, what the image
   says, CRC (frame.h). The first answer, with the number 0, says that the image is up. A machine that gets no answer must stop its
   motors itself; serial.c is the image that knows deadlines. */
#ifndef LINE_H
#define LINE_H

#include "board.h"
#include "frame.h"

/* Waits for a whole frame of `size` bytes. */
static inline void line_take(int size, uint8_t *frame)
{
    int have = 0;
    while (have < size) {
        int i = 0;
        frame[have++] = board_get();
        while (i < have && !frame_begins(size, have - i, frame + i))
            i++;
        have -= i;
        memmove(frame, frame + i, (size_t)have);
    }
}

/* The answer to it: number, faults and instructions of the tick, torques. */
static inline void line_answer(const uint8_t *frame, uint32_t faults, uint32_t used, int count, const float *tau)
{
    uint8_t bytes[4 * (5 + 8)];
    const int size = 4 * (5 + count);
    memcpy(bytes, frame, 8);
    frame_put(bytes, 2, faults);
    frame_put(bytes, 3, used);
    frame_put_floats(bytes, 4, count, tau);
    frame_seal(size, bytes);
    for (int i = 0; i < size; i++)
        board_put(bytes[i]);
}

#endif
