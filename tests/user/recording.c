/* SPDX-License-Identifier: MIT */
/* recording.c - examples/recording.h alone: recording FILE .. [KEY=VALUE ..] reads recordings of t and JOINTS positions and smooths
   them; or, with keys N, inputs, torque, smooth, unused, each, angles, dt, those of the column map, filter, that of such a model,
   and prints what was read; with all=1 also qdd and, in place of tau, the forces that belong to it, and the table of columns. With
   GROW the file gets more lines between the two times that it is read; with MOST that is the largest int. */
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
#include "files.h"

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
    file_list files = {NULL, 0};
    motion d;
    int all = 0, keys = 0, i, k;
    if (argc < 2) return 2;
    for (i = 1; i < argc; i++) {
        char *key = argv[i], *eq = i > 1 ? strchr(key, '=') : NULL;
        if (!eq) {
            add_files(&files, key);
            continue;
        }
        if (keys++ == 0) w.half = 0;
        *eq = 0;
        if (read_key(&w, key, eq + 1)) continue;
        if (strcmp(key, "dt") == 0) w.dt = atof(eq + 1);
        else if (strcmp(key, "all") == 0) all = w.tell = 1;
        else if (*key == 'a') w.half = 0, w.angles = (unsigned)atoi(eq + 1);
        else *(*key == 'N' ? &w.N : *key == 'i' ? &w.inputs : *key == 't' ? &w.torque : *key == 'u' ? &w.qd_unused
               : *key == 'e' ? &w.each : &w.half) = atoi(eq + 1);
    }
#ifdef GROW
    growing = argv[1];
#endif
    d = read_recordings(files.count, files.path, &w);
    if (w.half > 0) smooth(&d, w.half);
    printf("%d samples\n", d.samples);
    for (k = 0; k < d.trajectories && keys > 0; k++)
        for (i = d.first[k]; i < d.first[k + 1]; i++) {
            printf("%.6g:", d.dt * (i - d.first[k]));
            print(d.N, d.q + i * d.N), print(d.N * (d.has_qd || w.half > 0), d.qd + i * d.N);
            print(d.N * all, d.qdd + i * d.N);
            print(d.forces * d.has_tau, (all ? d.tau_mid : d.tau) + i * d.forces);
            printf(i + 1 < d.first[k + 1] ? "\n" : k + 1 < d.trajectories ? "\n\n" : "\n");
        }
    (void)add_noise; /* is the trainer's */
    return 0;
}
