/* SPDX-License-Identifier: MIT */
/* text.h - numbers as text, byte by byte through board_put: no buffer, no printf, no double. */
#ifndef TEXT_H
#define TEXT_H

#include "board.h"

#define TEXT_FN static __attribute__((unused))

TEXT_FN void put_text(const char *s)
{
    for (; *s; s++)
        board_put((uint8_t)*s);
}

/* x in hexadecimal, `digits` digits. */
TEXT_FN void put_hex(uint64_t x, int digits)
{
    for (int i = digits - 1; i >= 0; i--)
        board_put((uint8_t)"0123456789abcdef"[x >> (4 * i) & 15]);
}

/* x in decimal, right-aligned in `width` places. */
TEXT_FN void put_integer(uint32_t x, int width)
{
    char s[10];
    int n = 0;
    do s[n++] = (char)('0' + x % 10);
    while ((x /= 10) != 0);
    for (int i = n; i < width; i++)
        board_put(' ');
    while (n > 0)
        board_put((uint8_t)s[--n]);
}

/* x with `places` decimals in 8 + places characters; |x| < 2^32 / 10^places, else ****. */
TEXT_FN void put_real(float x, int places)
{
    const float size = x < 0 ? -x : x;
    uint32_t unit = 1;
    for (int i = 0; i < places; i++)
        unit *= 10;
    if (!(size * (float)unit < 4294967040.0f)) {
        put_text("    ****");
        return;
    }
    const uint32_t m = (uint32_t)(size * (float)unit + 0.5f), whole = m / unit;
    int width = 6;
    for (uint32_t rest = whole; rest >= 10; rest /= 10)
        width--;
    for (; width > 0; width--)
        board_put(' ');
    board_put(x < 0 ? '-' : ' ');
    put_integer(whole, 0);
    if (places > 0) board_put('.');
    for (uint32_t u = unit / 10, rest = m % unit; u > 0; rest %= u, u /= 10)
        board_put((uint8_t)('0' + rest / u));
}

#endif
