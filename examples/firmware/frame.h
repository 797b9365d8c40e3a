/* SPDX-License-Identifier: MIT */
/* frame.h - frames of fixed size between a machine and the controller of serial.c. Words of 32 bits, lowest byte first; N joints, n
   latent coordinates.

       to the controller   "rolt", number, q, qd [N], z_ref, zd_ref, zdd_ref [n], CRC      a tick
                           "rola", number, kp, kd [n], the rest 0, CRC                     arm: new gains, guard as new
       answer              "rolt", number of the last frame used, faults of this tick, faults since armed (ROLN_FAULT_.., LINK_..),
                           instructions of this tick, tau [N], CRC; the first one, all 0, after a reset

   The number of every frame is larger than that of the one before (modulo 2^32), by 1 if no tick was left out. */
#ifndef FRAME_H
#define FRAME_H

#include <stdint.h>
#include <string.h>

#define FRAME_FN static __attribute__((unused))
#define FRAME_START "rol"
#define FRAME_SIZE(N, n) (4 * (2 + 2 * (N) + 3 * (n) + 1))
#define FRAME_ANSWER(N) (4 * (5 + (N) + 1))

/* What the line did since the last answer, beside the faults of the guard. */
enum {
    LINK_NONE = 1 << 16,  /* the deadline passed without a new frame: a bad tick */
    LINK_GAP = 1 << 17,   /* numbers were left out: as many bad ticks, made up for before this one */
    LINK_OLD = 1 << 18,   /* a frame was not used: its number is not new, or nothing was armed */
    LINK_NOISE = 1 << 19  /* bytes that are no part of a whole frame */
};

FRAME_FN void frame_put(uint8_t *bytes, int word, uint32_t x)
{
    for (int k = 0; k < 4; k++)
        bytes[4 * word + k] = (uint8_t)(x >> (8 * k));
}

FRAME_FN uint32_t frame_get(const uint8_t *bytes, int word)
{
    uint32_t x = 0;
    for (int k = 0; k < 4; k++)
        x |= (uint32_t)bytes[4 * word + k] << (8 * k);
    return x;
}

FRAME_FN void frame_put_floats(uint8_t *bytes, int word, int count, const float *x)
{
    for (int i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, x + i, sizeof bits);
        frame_put(bytes, word + i, bits);
    }
}

FRAME_FN void frame_get_floats(const uint8_t *bytes, int word, int count, float *x)
{
    for (int i = 0; i < count; i++) {
        const uint32_t bits = frame_get(bytes, word + i);
        memcpy(x + i, &bits, sizeof bits);
    }
}

/* CRC-32 (IEEE 802.3): finds every damage of up to 32 bits in a row. */
FRAME_FN uint32_t frame_crc(int count, const uint8_t *bytes)
{
    uint32_t crc = 0xffffffff;
    for (int i = 0; i < count; i++) {
        crc ^= bytes[i];
        for (int k = 0; k < 8; k++)
            crc = crc >> 1 ^ (0xedb88320 & (0 - (crc & 1)));
    }
    return ~crc;
}

/* The last word of a frame of `size` bytes is the CRC of those before. */
FRAME_FN void frame_seal(int size, uint8_t *bytes)
{
    frame_put(bytes, size / 4 - 1, frame_crc(size - 4, bytes));
}

FRAME_FN int frame_whole(int size, const uint8_t *bytes)
{
    return frame_get(bytes, size / 4 - 1) == frame_crc(size - 4, bytes);
}

/* Nonzero if `count` <= size bytes are the first ones of a frame, or all of it. */
FRAME_FN int frame_begins(int size, int count, const uint8_t *bytes)
{
    const size_t start = count < 3 ? (size_t)count : 3;
    return memcmp(bytes, FRAME_START, start) == 0 && (count < size || frame_whole(size, bytes));
}

#endif
