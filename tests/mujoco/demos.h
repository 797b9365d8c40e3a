/* SPDX-License-Identifier: MIT */
/* demos.h - recordings of any length, and what they look like in files: CSV, as examples/train.c reads it, and HDF5.

   HDF5: a group /data with a group for each recording, as robomimic has it, in it t [S], q, qd [S,N] and tau [S,N] or u [S,inputs].
   What is written: groups demo_0, demo_1 .., all f64; attributes of /data: dt, model. /mask/train and /mask/test name them. What is
   read: groups or links of any name, in the order of people (demo_2 before demo_10), numbers of any type. */
#ifndef DEMOS_H
#define DEMOS_H

typedef struct {
    int samples, test; /* test: held out, in a file of its own */
    double *row;       /* [samples][1 + 2 N + forces]: t, q, qd, and tau or u */
} demo;

typedef struct {
    int N, forces; /* joints; columns tau or u, 0: neither */
    int inputs;    /* nonzero: they are u */
    double dt;     /* s from sample to sample */
    int count;
    demo *demo;
} demos;

/* Numbers of a sample. */
int demos_wide(const demos *d);

/* All functions returning int: 0, or -1 with the reason on stderr. */
int demos_add(demos *d, int samples, int test, const double *row); /* copies */
void demos_free(demos *d);
int demos_write_csv(const demos *d, int test, const char *path);
void demos_forget(const char *path); /* removes what a process that was killed in the middle wrote */
/* Adds the recordings of such a file, of N joints. What is behind q and qd are forces. */
int demos_read_csv(demos *d, const char *path);
int demos_write_h5(const demos *d, const char *model, const char *path);

/* What demos_read_h5 takes for q, qd, tau, u and t: names inside a recording, NULL: the first that is there of those that the
   comment of convert.c lists, "": none. states > 0: q and qd are columns 1 .. 2 states of `states`, MuJoCo's state of that many
   joints, whose column 0 is t. dt > 0: the time from sample to sample where there is no t. */
typedef struct {
    const char *q, *qd, *force, *t, *data;
    int states;
    double dt;
} layout;
int demos_read_h5(demos *d, const layout *want, const char *path);

#endif
