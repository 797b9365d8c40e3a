/* SPDX-License-Identifier: MIT */
/* fuzz_frames.c - serial frames: the whole of examples/firmware/serial.c, its line and its clock played by the input, a row of
   commands that send frames, damaged ones, parts of them, noise, silence. What it takes is what a second reader finds in the same
   bytes, every byte is answered for, and whatever comes, each answer is whole and its torques are finite and within the limit.
   line.h, the reader of other images, finds the same frames in the same bytes. */
#define main serial_main
int serial_main(void);
#include "firmware/serial.c"
#undef main
#include "firmware/line.h"
#include <math.h>
#include <setjmp.h>
#include "fuzz.h"

enum { STREAM = 1 << 15 };

/* What goes over the line: bytes, or a silence until the deadline; what came back; where the program ends. */
static struct {
    uint8_t bytes[STREAM], answer[ANSWER];
    int silent[STREAM / 8]; /* before which byte */
    int count, silences, at, quiet, have, answers;
    uint32_t clock, last, number;
    jmp_buf end;
} wire;

void board_exit(int code)
{
    (void)code;
    CLAIM(0);
}

uint32_t board_count(void)
{
    return wire.clock++;
}

int board_poll(void)
{
    if (wire.quiet < wire.silences && wire.silent[wire.quiet] == wire.at) {
        wire.quiet++, wire.clock += DEADLINE;
        return -1;
    }
    if (wire.at == wire.count) longjmp(wire.end, 1);
    return wire.bytes[wire.at++];
}

uint8_t board_get(void)
{
    if (wire.at == wire.count) longjmp(wire.end, 1);
    return wire.bytes[wire.at++];
}

/* ---- a second reader ---- */

/* CRC-32 by its table. */
static uint32_t crc_of(int count, const uint8_t *bytes)
{
    static uint32_t table[256];
    uint32_t crc = 0xffffffff, x;
    int i, k;
    for (i = 0; table[255] == 0 && i < 256; i++) {
        for (x = (uint32_t)i, k = 0; k < 8; k++)
            x = x & 1 ? x >> 1 ^ 0xedb88320 : x >> 1;
        table[i] = x;
    }
    for (i = 0; i < count; i++)
        crc = table[(crc ^ bytes[i]) & 255] ^ crc >> 8;
    return ~crc;
}

static uint32_t word_of(const uint8_t *bytes, int word)
{
    const uint8_t *p = bytes + 4 * word;
    return p[0] | (uint32_t)p[1] << 8 | (uint32_t)p[2] << 16 | (uint32_t)p[3] << 24;
}

/* Is a frame at i of the stream? */
static int frame_at(int i)
{
    const uint8_t *p = wire.bytes + i;
    return i + SIZE <= wire.count && p[0] == 'r' && p[1] == 'o' && p[2] == 'l' && word_of(p, SIZE / 4 - 1) == crc_of(SIZE - 4, p);
}

/* Frames that line.h takes: all, one behind the other. */
static void read_line_by(void)
{
    volatile int seen = 0, from = 0;
    int i;
    wire.at = 0;
    if (!setjmp(wire.end))
        for (;;) {
            uint8_t frame[SIZE];
            line_take(SIZE, frame);
            for (i = from; !frame_at(i); i++)
                ;
            CLAIM(memcmp(frame, wire.bytes + i, SIZE) == 0 && wire.at == i + SIZE);
            from = i + SIZE, seen = seen + 1;
            fuzz_call();
        }
    for (i = from; i < wire.count; i++)
        CLAIM(!frame_at(i));
}

/* An answer is whole, from the last frame that was new, and its torques are finite and within the limit. */
static void judge_answer(void)
{
    const uint8_t *p = wire.answer;
    const uint32_t faults = word_of(p, 2);
    int i, zero = 1;
    CLAIM(memcmp(p, "rolt", 4) == 0 && word_of(p, ANSWER / 4 - 1) == crc_of(ANSWER - 4, p));
    CLAIM((word_of(p, 3) & faults) == faults);
    for (i = 0; i < N; i++) {
        const uint32_t bits = word_of(p, 5 + i);
        float tau;
        memcpy(&tau, &bits, sizeof tau);
        CLAIM(isfinite(tau) && fabsf(tau) <= limits.tau);
        zero &= tau == 0;
    }
    CLAIM(!(faults & ROLN_FAULT_EXPIRED) || zero);
    CLAIM(!(faults & LINK_NONE) || faults & ROLN_FAULT_STATUS); /* without a frame nothing passes the guard */
    CLAIM(wire.answers > 0 || (faults == 0 && zero));
    wire.last = word_of(p, 1), wire.answers++, wire.have = 0;
    fuzz_call();
}

void board_put(uint8_t byte)
{
    wire.answer[wire.have++] = byte;
    if (wire.have == ANSWER) judge_answer();
}

/* Frames that are new, in the order in which they come: each, and each silence once one has armed, is answered. */
static int answers_due(void)
{
    int i = 0, q = 0, armed = 0, due = 1;
    uint32_t last = 0;
    while (i <= wire.count) {
        for (; q < wire.silences && wire.silent[q] <= i; q++)
            due += armed;
        if (frame_at(i)) {
            const uint8_t letter = wire.bytes[i + 3];
            const uint32_t number = word_of(wire.bytes + i, 1);
            for (; q < wire.silences && wire.silent[q] < i + SIZE; q++) /* in the middle of it */
                due += armed;
            const int new = !armed || (int32_t)(number - last) > 0;
            if (new && (letter == 'a' || (armed && letter == 't'))) armed = 1, last = number, due++;
            i += SIZE;
        } else i++;
    }
    return due;
}

/* ---- what is sent ---- */

static void put_float(uint8_t *frame, int word, float x)
{
    frame_put_floats(frame, word, 1, &x);
}

/* A frame: a pose that the model knows, or numbers of any kind; the next number, or another. */
static void frame_of(fuzz_input *in, unsigned command, uint8_t *frame)
{
    int i;
    fuzz_now.seed = fuzz_pair(in), fuzz_now.odd = command & 8 ? fuzz_byte(in) : 0;
    memset(frame, 0, SIZE);
    memcpy(frame, command & 16 ? "rola" : "rolt", 4);
    wire.number += command & 32 ? 1 : command & 64 ? fuzz_byte(in) : fuzz_word(in);
    frame_put(frame, 1, wire.number);
    for (i = 2; i < SIZE / 4 - 1; i++)
        put_float(frame, i, command & 8 ? (float)fuzz_real() : command & 16 ? 5 : 0.01f * (float)fuzz_kind(0, &fuzz_now.seed));
    frame_seal(SIZE, frame);
}

static void send(const uint8_t *bytes, int count)
{
    if (count > STREAM - wire.count) count = STREAM - wire.count;
    memcpy(wire.bytes + wire.count, bytes, (size_t)count);
    wire.count += count;
}

static void send_next(fuzz_input *in)
{
    const unsigned command = fuzz_byte(in);
    uint8_t frame[SIZE];
    int i;
    frame_of(in, command, frame);
    switch (command & 7) {
    case 0: case 1: case 2: send(frame, SIZE); break;
    case 3: i = (int)fuzz_pair(in) % (8 * SIZE), frame[i / 8] ^= (uint8_t)(1 << i % 8), send(frame, SIZE); break;
    case 4: send(frame, (int)fuzz_byte(in) % SIZE); break;
    case 5: i = (int)fuzz_byte(in) % SIZE, send(frame + i, SIZE - i); break;
    case 6:
        for (i = (int)fuzz_byte(in) % 16; i > 0; i--)
            frame[i] = command & 128 ? (uint8_t) "rol"[i % 3] : (uint8_t)fuzz_byte(in);
        send(frame + 1, 15);
        break;
    default:
        if (wire.silences < (int)(sizeof wire.silent / sizeof *wire.silent)) wire.silent[wire.silences++] = wire.count;
        break;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input in = {data, data + size};
    memset(&ctl, 0, sizeof ctl), memset(&line, 0, sizeof line);
    memset(&wire, 0, sizeof wire);
    while (in.at < in.end)
        send_next(&in);
    if (!setjmp(wire.end)) serial_main();
    CLAIM(wire.at == wire.count && wire.have == 0 && wire.answers == answers_due());
    read_line_by();
    return 0;
}
