/* experiment.h - the parts of the paper's experiments, from the data up to the run list. float throughout, as in firmware;
   sums of errors in double. Functions returning int: 0, or -1 with the reason on stderr. */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include <stdint.h>
#include <stdio.h>

#include "../../roln.h"
#include "../mujoco/truth.h"

/* ---- motion.c: recorded motion ---- */

struct motion {
    enum truth_system system;
    int count, samples, N;                  /* trajectories, samples of each */
    double dt;                              /* s between samples */
    roln_real *q, *qd, *qdd, *tau;          /* [count * samples][N]; tau held to the next sample; NULL: no force does work */
    roln_real *tau_mid;                     /* the force at the sample, for accelerations; NULL with tau */
    roln_real *mean;                        /* [N] of the training q: what errors are relative to */
};

/* POD of q: q = mean + W a + what is left. */
struct pod {
    int N, r;
    roln_real *W;                           /* [N][r], orthonormal columns, largest first */
};

/* ---- measure.c: a model under test ---- */

/* state: [state] numbers of its own. step: h seconds, force [N] held (NULL: none). accelerate: qdd [N] of a full state.
   energy: kinetic and potential, NULL if it has none. All but energy return a status. */
struct predictor {
    int N, state;
    void *self;
    roln_status (*encode)(void *self, const roln_real *q, const roln_real *qd, roln_real *s);
    roln_status (*step)(void *self, roln_real *s, const roln_real *tau, double h);
    roln_status (*decode)(void *self, const roln_real *s, roln_real *q, roln_real *qd);
    roln_status (*accelerate)(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd);
    void (*energy)(void *self, const roln_real *s, double *T, double *V);
};

/* ---- latent.c: other models of the motion of z, in the latent space of a trained autoencoder ---- */

enum latent_kind {
    LATENT_MLP,     /* no structure: zdd = f(z, zd, tau_z) */
    LATENT_HNN,     /* Hamiltonian network on (z, zd) (Greydanus et al. 2019) */
    LATENT_DHNN,    /* dissipative HNN (Sosanya and Greydanus 2022) */
    LATENT_SYMODEN, /* dissipative SymODEN (Zhong et al. 2020) */
    LATENT_COMET,   /* constants of motion network (Kasim and Lim 2022) */
    LATENT_KINDS
};

/* Samples in scaled units (order one): z, zd, zdd, tau_z [count][n]; tau_z NULL: none. */
struct latent_data {
    int count, n;
    const roln_real *z, *zd, *zdd, *tau_z;
};

struct latent;
/* Adam with the falling rate of roln_schedule, `updates` batches of `batch` samples, networks of 2 x 64 softplus. */
int latent_train(struct latent **m, enum latent_kind kind, const struct latent_data *d, int updates, int batch, double rate,
                 uint64_t seed);
void latent_free(struct latent *m);
int latent_params(const struct latent *m);
/* sd [2n] = d/dt of s = [z; zd] under tau_z [n] (NULL: 0). */
roln_status latent_rate(const struct latent *m, const roln_real *s, const roln_real *tau_z, roln_real *sd);
/* Its own energy, or what it takes for one; returns 0 if it has none. */
int latent_energy(const struct latent *m, const roln_real *s, double *E);

/* ---- opinf.c: Lagrangian operator inference in POD coordinates ---- */

struct opinf;
/* affine 0: as published (Sharma and Kramer 2024): q = W z uncentred, zdd + K z = W^T tau, K positive semi-definite;
   1: the stronger form, centred, zdd + C zd + K z - f = W^T tau, K and C positive semi-definite. */
int opinf_fit(struct opinf **o, int affine, int n, const struct motion *train);
void opinf_free(struct opinf *o);
int opinf_params(const struct opinf *o);
struct predictor opinf_predictor(struct opinf *o);      /* integrates with the variational midpoint rule */

#endif
