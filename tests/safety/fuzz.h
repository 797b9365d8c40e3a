/* SPDX-License-Identifier: MIT */
/* fuzz.h - what the targets share: bytes of an input, numbers of every kind, claims, a count of calls. A target defines
   LLVMFuzzerTestOneInput; libFuzzer finds the inputs. Include after a header of roln. */
#ifndef FUZZ_H
#define FUZZ_H

#include <stdio.h>
#include <stdlib.h>
#if defined __has_feature
#if __has_feature(memory_sanitizer)
#include <sanitizer/msan_interface.h>
#define FUZZ_SPOIL(p, size) __msan_poison(p, size)
#endif
#endif
#ifndef FUZZ_SPOIL /* scratch, of which no result depends: unknown to the memory sanitizer, else other bytes each time */
#define FUZZ_SPOIL(p, size) memset(p, (int)(fuzz_calls & 255), size)
#endif

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Calls of what is tested: an input holds several. */
static unsigned long long fuzz_calls;

static void fuzz_report(void)
{
    fprintf(stderr, "calls %llu\n", fuzz_calls);
}

/* A call, and with the first one the promise to say how many there were. */
static void fuzz_call(void)
{
    if (fuzz_calls++ == 0) atexit(fuzz_report);
}

/* A claim that does not hold ends the program, so that the input is kept. */
#define CLAIM(cond) ((cond) ? (void)0 : fuzz_broken(#cond, __FILE__, __LINE__))
static void fuzz_broken(const char *what, const char *file, int row)
{
    fprintf(stderr, "%s:%d: does not hold: %s\n", file, row, what);
    abort();
}

/* ---- bytes of an input ---- */

typedef struct {
    const uint8_t *at, *end;
} fuzz_input;

/* The next byte; 0 behind the end. */
ROLN_FN unsigned fuzz_byte(fuzz_input *in)
{
    return in->at < in->end ? *in->at++ : 0;
}

ROLN_FN unsigned fuzz_pair(fuzz_input *in)
{
    const unsigned low = fuzz_byte(in);
    return low | fuzz_byte(in) << 8;
}

ROLN_FN uint32_t fuzz_word(fuzz_input *in)
{
    const uint32_t low = fuzz_pair(in);
    return low | (uint32_t)fuzz_pair(in) << 16;
}

/* ---- numbers ---- */

ROLN_FN roln_real fuzz_bits(roln_bits b)
{
    roln_real x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* Kinds: 0 ordinary; 1 any power of two; 2 denormal; 3 zero; 4 infinite; 5 NaN; 6 any bits; 7 the ends of what there is. */
ROLN_FN roln_real fuzz_kind(int kind, uint64_t *seed)
{
    const int mant = sizeof(roln_real) == 4 ? 23 : 52, bits = 8 * (int)sizeof(roln_real);
    const roln_bits one = 1, sign = one << (bits - 1), inf = (sign - 1) >> mant << mant, half = inf / 2 >> mant << mant;
    const roln_bits ends[8] = {inf - 1, one << mant, (one << mant) - 1, 1, half, half - 1, half + 1, inf - (one << mant)};
    const roln_bits random = (roln_bits)roln_rand(seed), side = random & 1 ? sign : 0;
    switch (kind) {
    case 1: return fuzz_bits(side | (random % (inf >> mant)) << mant);
    case 2: return fuzz_bits(side | (random & ((one << mant) - 1)));
    case 3: return fuzz_bits(side);
    case 4: return fuzz_bits(side | inf);
    case 5: return fuzz_bits(side | inf | one << (mant - 1) | (random >> 9 & 15));
    case 6: return fuzz_bits(random);
    case 7: return fuzz_bits(side | ends[random >> 1 & 7]);
    default: return (roln_real)roln_randint(65536, seed) / 32768 - 1;
    }
}

/* How odd the numbers of a call are: bits 0-1: none, one in 16, one in 4, all of them; bits 2-4: of which kind, 0: any; bits 5-7:
   ordinary ones are up to 1, 1e-3, 10, 100, 1e4 .. */
static struct {
    uint64_t seed;
    unsigned odd;
} fuzz_now;

ROLN_FN roln_real fuzz_real(void)
{
    static const roln_real size[8] = {1, ROLN_C(1e-3), 10, 1, ROLN_C(0.1), 100, ROLN_C(1e4), 1};
    static const int parts[4] = {0, 1, 4, 16};
    const int odd = roln_randint(16, &fuzz_now.seed) < parts[fuzz_now.odd & 3], kind = (int)(fuzz_now.odd >> 2 & 7);
    if (!odd) return size[fuzz_now.odd >> 5 & 7] * fuzz_kind(0, &fuzz_now.seed);
    return fuzz_kind(kind > 0 ? kind : 1 + roln_randint(7, &fuzz_now.seed), &fuzz_now.seed);
}

ROLN_FN void fuzz_reals(int n, roln_real *x)
{
    while (n-- > 0)
        *x++ = fuzz_real();
}

/* One that is meant to be positive, and mostly is. */
ROLN_FN roln_real fuzz_positive(void)
{
    const roln_real x = fuzz_real();
    return x < 0 && roln_randint(16, &fuzz_now.seed) ? -x : x;
}

ROLN_FN void fuzz_positives(int n, roln_real *x)
{
    while (n-- > 0)
        *x++ = fuzz_positive();
}

/* 0 .. n-1 */
ROLN_FN int fuzz_below(int n)
{
    return roln_randint(n, &fuzz_now.seed);
}

/* ---- outputs ---- */

/* What outputs were before a call, and what is claimed of them behind it: untouched if it failed, else finite. */
static union {
    unsigned char bytes[1 << 17];
    roln_real number;
} fuzz_was;

ROLN_FN void fuzz_keep(const void *out, size_t size)
{
    CLAIM(size <= sizeof fuzz_was);
    memcpy(fuzz_was.bytes, out, size);
}

ROLN_FN int fuzz_kept(const void *out, size_t size)
{
    return memcmp(fuzz_was.bytes, out, size) == 0;
}

#define fuzz_judge(st, out, size) fuzz_judge_at(st, out, size, __FILE__, __LINE__)
ROLN_FN void fuzz_judge_at(roln_status st, const void *out, size_t size, const char *file, int row)
{
    fuzz_call();
    if (st == ROLN_OK && !roln_all_finite((int)(size / sizeof(roln_real)), (const roln_real *)out))
        fuzz_broken("ROLN_OK, and outputs are finite", file, row);
    if (st != ROLN_OK && !fuzz_kept(out, size)) fuzz_broken("a failure, and outputs are untouched", file, row);
}

#endif
