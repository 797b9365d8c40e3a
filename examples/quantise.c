/* SPDX-License-Identifier: MIT */
/* quantise.c - weights of a trained model for less flash: int8 or half-precision numbers instead of floats.

   cc -std=c99 -O2 -I. -Iexamples -DMODEL=pend16_int8 examples/quantise.c -o quantise -lm
   ./quantise pend16.roln

   MODEL is the ROLN_NAME of a config header named after it: that of the trained model but for the name and ROLN_QUANTISE. The
   bytes are those of train.c, which records the range of z that the rounding needs: from a model without one (z_min < z_max)
   nothing is written. Writes MODEL_weights.h, the C definition for flash. */

#include <stdio.h>

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

int main(int argc, char **argv)
{
    static unsigned char bytes[M(full_packed_size) + 1];
    static M(params) params;
    static M(start) work;
    const char *path = STRING(MODEL) "_weights.h";
    FILE *f = argc == 2 ? fopen(argv[1], "rb") : NULL;
    roln_status st;
    int count;
    if (!f) return fprintf(stderr, "usage: quantise MODEL.roln, a file that can be read\n"), 1;
    count = (int)fread(bytes, 1, sizeof bytes, f);
    fclose(f);
    st = M(quantise)(count, bytes, &params, &work.quantise);
    if (st == ROLN_E_RANGE)
        return fprintf(stderr, "%s: no range z_min < z_max (NAME_fit_range), or a weight that no half can hold\n", argv[1]), 1;
    if (st != ROLN_OK) return fprintf(stderr, "%s: %s\n", argv[1], roln_status_text(st)), 1;
    f = fopen(path, "w");
    if (!f || M(write)(&params, put_file, f) != ROLN_OK || fclose(f) != 0) return fprintf(stderr, "cannot write %s\n", path), 1;
    printf("%s: %u bytes of flash instead of %u\n", path, (unsigned)sizeof params,
           (unsigned)(sizeof params + 4u * (M(full_size) - M(theta_size))));
    return 0;
}
