/* SPDX-License-Identifier: MIT */
/* recipes.h - the run list: what is trained on what, how long, and with how many seeds. */
#ifndef RECIPES_H
#define RECIPES_H

#include "experiment.h"

enum kind { LAGRANGE, LATENT, CHART, OPINF, OPINF_AFFINE, FIT }; /* CHART: an autoencoder alone */
enum { STAGES = 6, TESTS = 10 };        /* stages of training at most; test trajectories */

struct recipe {
    const char *name;                   /* a run is NAME-SEED */
    enum kind kind;
    enum truth_system system;
    int train;                          /* trajectories simulated for training */
    double force;                       /* unit of tau, N or N m; 0: the model gets none */
    int seeds;                          /* 1 .. */
    double seconds;                     /* of training, on one core */
    int pod;                            /* POD coordinates in which to train; 0: none */
    enum latent_kind latent;            /* LATENT */
    int n;                              /* OPINF */
    struct shape shape;                 /* LAGRANGE; of LATENT the autoencoder */
    struct stage stage[STAGES];         /* LATENT: NEWTON is that of the latent model */
};

extern const struct recipe recipes[];
extern const int recipes_count;

const struct recipe *recipe_of(const char *name);                   /* NULL: no such */
const struct recipe *recipe_of_run(const char *run, int *seed);
struct shape recipe_shape(const struct recipe *e);                  /* of its weights, those of the full coordinates */
void recipes_list(void);                /* to stdout, a line each: run, trajectories simulated, system */

#endif
