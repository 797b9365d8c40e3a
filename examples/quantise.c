/* SPDX-License-Identifier: MIT */
/* quantise.c - weights of a trained model for less flash: int8 or half-precision numbers instead of floats.

   cc -std=c99 -O2 -I. -Iexamples -DMODEL=pend16_int8 examples/quantise.c -o quantise -lm
   ./quantise pend16.roln

   MODEL is the ROLN_NAME of a config header named after it: that of the trained model but for the name and ROLN_QUANTISE. The
   bytes are those of train.c, which records the range of z that the rounding needs: from a model without one (z_min < z_max)
   nothing is written. Writes MODEL_weights.h, the C definition for flash. */

#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L
#endif
#include "whole.h"
#include <signal.h>
#include <string.h>

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) <m.h>
#define HEADER(m) HEADER_(m)
#include HEADER(MODEL)

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name)

static void put_file(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

static int failed(const char *path, const char *what, const char *hint)
{
    fprintf(stderr, "%s: %s\nhint: %s\n", path, what, hint);
    return 1;
}

int main(int argc, char **argv)
{
    static unsigned char bytes[M(full_packed_size) + 1];
    static M(params) params;
    static M(start) work;
    const char *path = STRING(MODEL) "_weights.h", *part = STRING(MODEL) ".part";
    FILE *f;
    roln_status st;
    int count;
    if (argc != 2) return fprintf(stderr, "usage: quantise MODEL.roln\nhint: the bytes that train.c writes\n"), 1;
    if (!(f = fopen(argv[1], "rb"))) return failed(argv[1], strerror(errno), "check the path");
    count = (int)fread(bytes, 1, sizeof bytes, f);
    fclose(f);
    st = M(quantise)(count, bytes, &params, &work.quantise);
    if (st == ROLN_E_RANGE)
        return failed(argv[1], "no range z_min < z_max, or a weight that no half can hold", "range.c, or NAME_fit_range");
    if (st != ROLN_OK) return failed(argv[1], roln_status_text(st), "is it of this config, but for ROLN_QUANTISE, and whole?");
#ifdef SIGXFSZ
    signal(SIGXFSZ, SIG_IGN); /* a file that is too large: writing fails */
#endif
    if (!(f = fopen(part, "w"))) return failed(part, strerror(errno), "a directory that may be written to");
    if (M(write)(&params, put_file, f) != ROLN_OK) return failed(argv[1], "a weight that is no C constant", "train it again");
    if (!put_whole(f, part, path)) return failed(path, strerror(errno), "make room; the old file stays");
    printf("%s: %u bytes of flash instead of %u\n", path, (unsigned)sizeof params,
           (unsigned)(sizeof params + 4u * (M(full_size) - M(theta_size))));
    return 0;
}
