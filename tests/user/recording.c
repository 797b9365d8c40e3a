/* SPDX-License-Identifier: MIT */
/* recording.c - examples/recording.h alone, for train.sh: a recording of t and JOINTS positions. With GROW the file gets more lines
   between the two times that it is read; with MOST that is the largest int. */
#include "roln_spd.h"
#include <limits.h>
#include <stdio.h>

#ifdef MOST
#undef INT_MAX
#define INT_MAX MOST
#endif

#ifdef GROW
static const char *growing;

/* What the reader calls between the two. */
static void grow(FILE *f)
{
    FILE *same = fopen(growing, "a");
    int i;
    for (i = 0; same && i < GROW; i++)
        fprintf(same, "%d,0\n", i);
    if (same) fclose(same);
    rewind(f);
}
#define rewind grow
#endif

#include "recording.h"

int main(int argc, char **argv)
{
    const wanted w = {.model = "the model", .N = JOINTS, .half = 1};
    motion d;
    if (argc != 2) return 2;
#ifdef GROW
    growing = argv[1];
#endif
    d = read_recording(argv[1], &w);
    smooth(&d, w.half);
    printf("%d samples\n", d.samples);
    return 0;
}
