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
    int recorded;                       /* seed of the simulation; 0: 1 */
    int train, tests;                   /* trajectories simulated for training and for errors; tests 0: TESTS */
    double force;                       /* unit of tau, N or N m; 0: the model gets none */
    int seeds;                          /* 1 .. */
    double seconds;                     /* of training, on one core */
    int pod;                            /* POD coordinates in which to train; 0: none */
    enum latent_kind latent;            /* LATENT */
    int n;                              /* OPINF */
    const char *config;                 /* row of configs.h, of LAGRANGE; of LATENT, CHART the autoencoder */
    const struct config *model, *whole;   /* its models; NULL: not in this program. whole: of all coordinates, if there is a pod */
    double zoom;                        /* data are scaled to `zoom` times their usual size at the start; 0: 1 */
    struct stage stage[STAGES];         /* LATENT: NEWTON is that of the latent model */
};

extern const struct recipe recipes[];
extern const int recipes_count;

const struct recipe *recipe_of(const char *name);                   /* NULL: no such */
const struct recipe *recipe_of_run(const char *run, int *seed);
const struct config *recipe_weights(const struct recipe *e);        /* whose its weights are, of all coordinates; NULL: not here */
void recipes_list(void);                /* to stdout, a line each: run, trajectories simulated, system */
void recipes_configs(void);             /* run, row of configs.h, - if it needs none */

#endif
