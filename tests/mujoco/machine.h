/* SPDX-License-Identifier: MIT */
/* machine.h - the machine that record.c records, and the files that config.c writes about it. */
#ifndef MACHINE_H
#define MACHINE_H

#include <mujoco/mujoco.h>

#include "demos.h"

#define PI 3.14159265358979323846
enum { UNSTABLE, STOPPED, TOUCHED, STILL, LOSSES }; /* why a recording is not kept */

extern struct machine {
    mjModel *m;
    mjData *d;
    double dt, step_error;        /* s of a sample; what half the step changes, of the motion */
    int steps;                    /* of a sample */
    int columns;                  /* of tau */
    int servos;                   /* motors that are more than a force times a gear */
    int full;                     /* nonzero: motors move every joint */
    int taut;                     /* tendons whose limit acts at rest */
    int untouched;                /* nonzero: contacts are switched off */
    int least;                    /* samples of the shortest recording that is kept */
    double spread;                /* of amplitudes, at first 1 */
    double *force;                /* [nv] a force that moves a joint well */
    double *speed;                /* [nv] a speed that suits it */
    double *moment;               /* [nu][nv] B^T of the motors, in the pose that the model begins in */
    double *want;                 /* [2 nv] the controller's */
    double *pull, *rate;          /* [nu] a motor's force that moves its joints well; the speed of its length */
    int *still, *angle;           /* [nv] neither gravity nor a spring moves it; the proposed model sees it as an angle */
    int *full_samples, *full_now; /* [nu] samples in which a motor gave all it has: of the recordings kept, of one */
    char why[300];                /* the last one was unstable */
    char where[200];              /* the limit or contact that ended the last recording that was too short */
    int stopped, touched;         /* of one recording: a limit, a contact ended it */
    int turns, stops, contacts, kept, lost[LOSSES]; /* recordings that turn round; end at limits, contacts; are left out */
    int unwilling;                /* of next=, recordings that are left out */
    double began, told;                             /* s, of the program and of the last line about progress */
} rig;

/* Prints "record: ..." and ends with 1. */
void fail(const char *format, ...);
/* Ends so, of a file that cannot be written. */
void refuse_place(const char *path);
/* Zeros, to be freed. */
void *room(size_t bytes);
/* Nonzero if joint j is a hinge; and if a turn of it changes nothing. */
int hinge(int j);
int periodic(int j);
/* A pose in which the tendons that are taut at rest are taut. */
void find_strings(void);

/* Latent coordinates and the degree of the chart; n = N: no autoencoder. docs/training.md, Which config. */
typedef struct {
    int n, degree, equalities;
} shape;

shape propose(const demos *d);

enum { OWN, FULL, ANGLES }; /* the config that is proposed; of all joints, without autoencoder; with all hinges as angles */
void write_config(const char *name, const char *path, const char *model, const shape *s, int which);
/* Nonzero if there are hinges that the proposed config does not see as angles and that could be. */
int more_angles(const shape *s);
/* Nonzero if drag grows with the square of the speed. */
int drags(void);
/* E_q of the motion carried on at constant velocity, q + h qd, on the recordings for tests, as CSV. */
void write_constant(const demos *d, const char *path);
/* OUT with a last part that is a name in C, of at most 80 letters, and no name of other files: in `to`. With a model: none that
   another model has used already. */
void map_out(const char *out, const char *model, char to[4096]);

#endif
