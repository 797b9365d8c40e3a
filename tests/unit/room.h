/* SPDX-License-Identifier: MIT */
/* room.h - scratch that remembers how far it was written, of numbers and of doubles. Include after a header of roln. */
#ifndef ROOM_H
#define ROOM_H

enum { ROOM_SIZE = 400000, ROOM_MARGIN = 64 };
static roln_real room[ROOM_SIZE];
static int room_end;

/* Scratch of n numbers, each a NaN of its own bits, and a margin behind it. */
ROLN_FN roln_real *room_of(int n)
{
    const roln_bits nan = ~(roln_bits)0x5a5a;
    int i;
    for (i = 0; i < n + ROOM_MARGIN && i < ROOM_SIZE; i++)
        memcpy(room + i, &nan, sizeof nan);
    room_end = n;
    return n + ROOM_MARGIN <= ROOM_SIZE ? room : NULL;
}

/* How many numbers from the start the highest one written takes. */
ROLN_FN int room_used(void)
{
    const roln_bits nan = ~(roln_bits)0x5a5a;
    int i = room_end + ROOM_MARGIN;
    while (i > 0 && memcmp(room + i - 1, &nan, sizeof nan) == 0)
        i--;
    return i;
}

/* The size that was asked for is the size that was written, to a number or two. */
#define CHECK_ROOM() (CHECK_BELOW(room_used(), room_end), CHECK_BELOW(room_end - 2, room_used()))

enum { AREA_SIZE = 20000 };
static double area[AREA_SIZE];

/* The same of n doubles; but for one or two all of them are written. */
ROLN_FN double *area_of(int n)
{
    int i;
    for (i = 0; i < AREA_SIZE; i++)
        area[i] = 1.25e-77;
    return n + ROOM_MARGIN <= AREA_SIZE ? area : NULL;
}

ROLN_FN int area_used(int n)
{
    int i = n + ROOM_MARGIN;
    while (i > 0 && area[i - 1] >= 1.25e-77 && area[i - 1] <= 1.25e-77)
        i--;
    return i;
}
#define CHECK_AREA(n) (CHECK_BELOW(area_used(n), n), CHECK_BELOW((n) - 2, area_used(n)))

#endif
