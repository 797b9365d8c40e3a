/* recipes.h - the run list: what is trained on what, how long, and with how many seeds. */
#ifndef RECIPES_H
#define RECIPES_H

#include "experiment.h"

enum kind { LAGRANGE, LATENT, OPINF, OPINF_AFFINE, FIT };
enum { STAGES = 6, TESTS = 10 };        /* stages of training at most; test trajectories */

struct recipe {
    const char *name;                   /* a run is NAME-SEED */
    enum kind kind;
    enum truth_system system;
    int train;                          /* trajectories simulated for training */
    double force;                       /* unit of tau, N or N m; 0: the model gets none */
    int seeds;                          /* 1 .. */
    int pod;                            /* POD coordinates in which to train; 0: none */
    const char *parent;                 /* recipe whose weights, of the same seed, are the start or the autoencoder */
    int fresh;                          /* of the parent only the autoencoder */
    enum latent_kind latent;            /* LATENT */
    int n;                              /* OPINF */
    struct shape shape;                 /* LAGRANGE */
    struct stage stage[STAGES];         /* LATENT: updates, batch, lr_net of the first */
};

extern const struct recipe recipes[];
extern const int recipes_count;

const struct recipe *recipe_of(const char *name);                   /* NULL: no such */
const struct recipe *recipe_of_run(const char *run, int *seed);
void recipes_list(void);                /* to stdout, a line each: run, parent run or -, trajectories simulated, system */

#endif
