/* SPDX-License-Identifier: MIT */
/* recording.c - examples/recording.h alone: recording FILE [KEY=NUMBER ..] reads a recording of t and JOINTS positions and smooths
   them; or, with keys N, inputs, torque, smooth, unused, each, angles, that of such a model, and prints what was read. With GROW
   the file gets more lines between the two times that it is read; with MOST that is the largest int. */
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

#ifndef JOINTS
#define JOINTS 1
#endif

/* Numbers of a sample, blanks between them. */
static void print(int n, const roln_real *x)
{
    int i;
    for (i = 0; i < n; i++)
        printf(" %.6g", (double)x[i]);
}

int main(int argc, char **argv)
{
    wanted w = {.model = "the model", .N = JOINTS, .half = 1};
    motion d;
    int i, k;
    if (argc < 2) return 2;
    if (argc > 2) w.half = 0;
    for (i = 2; i < argc; i++) {
        const int x = atoi(argv[i] + strcspn(argv[i], "=") + 1);
        *(*argv[i] == 'N'   ? &w.N
          : *argv[i] == 'i' ? &w.inputs
          : *argv[i] == 't' ? &w.torque
          : *argv[i] == 'u' ? &w.qd_unused
          : *argv[i] == 'e' ? &w.each
                            : &w.half) = x;
        if (*argv[i] == 'a') w.half = 0, w.angles = (unsigned)x;
    }
#ifdef GROW
    growing = argv[1];
#endif
    d = read_recording(argv[1], &w);
    if (w.half > 0) smooth(&d, w.half);
    printf("%d samples\n", d.samples);
    for (k = 0; k < d.trajectories && argc > 2; k++)
        for (i = d.first[k]; i < d.first[k + 1]; i++) {
            printf("%.6g:", d.dt * (i - d.first[k]));
            print(d.N, d.q + i * d.N), print(d.N * (d.has_qd || w.half > 0), d.qd + i * d.N);
            print(d.forces * d.has_tau, d.tau + i * d.forces);
            printf(i + 1 < d.first[k + 1] ? "\n" : k + 1 < d.trajectories ? "\n\n" : "\n");
        }
    return 0;
}
