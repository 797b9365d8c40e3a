/* SPDX-License-Identifier: MIT */
/* experiment.h - the parts of the paper's experiments, from the data up to the run list. float throughout, as in firmware;
   sums of errors in double. Functions returning int: 0, or -1 with the reason on stderr. */
#ifndef EXPERIMENT_H
#define EXPERIMENT_H

#include <stdint.h>
#include <stdio.h>

#include "roln.h"
#include "../mujoco/truth.h"

/* ---- motion.c: recorded motion ---- */

struct motion {
    enum truth_system system;
    int count, samples, N;                  /* trajectories, samples of each */
    double dt;                              /* s between samples */
    roln_real *q, *qd, *qdd;                /* [count * samples][N]; qdd by central differences of qd */
    roln_real *tau, *tau_mid;               /* held to the next sample; mean of before and after it; NULL: no force does work */
    roln_real *mean;                        /* [N] of the training q; of a test set: what errors are relative to */
    double force;                           /* unit of tau in N */
};

/* The first `count` trajectories of a system that is simulated with `seed`; 0: 1. mean NULL: their own. force: unit of tau, in N or
   N m, so that masses are of order one in the model's units; 0: the model does not get tau. */
int motion_simulate(struct motion *d, enum truth_system system, enum truth_split split, int seed, int count, double force,
                    const roln_real *mean);
void motion_free(struct motion *d);

/* q, qd, qdd of a parabola through 2 half + 1 samples of q, tau_mid of one through the forces: for accelerations of slow
   coordinates under fast vibrations. */
int motion_smooth(struct motion *a, const struct motion *d, int half);

/* POD, q = mean + W a + what is left: W [N][r] with orthonormal columns, in the order of their share. */
struct pod {
    int N, r;
    double *W;
};
int pod_fit(struct pod *p, const struct motion *d, int r);
void pod_free(struct pod *p);
/* The same motion in the coordinates a = W^T (q - mean), of force W^T tau. */
int motion_project(struct motion *a, const struct motion *d, const struct pod *p);

/* ---- measure.c: a model under test ---- */

/* state: numbers of its state. step: h seconds, force [N] held (NULL: none). accelerate: qdd [N] of a full state.
   energy: kinetic and potential; NULL if it has none, or loses it. */
struct predictor {
    int N, state;
    void *self;
    roln_status (*encode)(void *self, const roln_real *q, const roln_real *qd, roln_real *s);
    roln_status (*step)(void *self, roln_real *s, const roln_real *tau, double h);
    roln_status (*decode)(void *self, const roln_real *s, roln_real *q, roln_real *qd);
    roln_status (*accelerate)(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd);
    void (*energy)(void *self, const roln_real *s, double *T, double *V);
};

/* Errors on the motion d as lines `key argument value` to out, in percent; integrator steps are one sample long.
     E_q, E_qd, E_qdd MS sqrt(mean |q_pred - q|^2 / mean |q - mean|^2) at the end of windows that start every 25 ms, or 100 ms
                         where they are longer than that; MS = 0: reconstruction; qd, qdd the same, not centred; qdd is the
                         model's at its predicted state
     E_q whole, ..       one roll-out per trajectory, mean over all its samples
     failed MS           windows whose roll-out ended with a status; its last good state then counts
     drift own           largest |E - E(0) - work| of the model's own energy over its largest T, whole roll-outs
     drift true          the same of MuJoCo's energy along the prediction
     trivial MS          E_q of q + h qd
     us step, encode, decode       microseconds */
int measure(const struct predictor *p, const struct motion *d, const int *ms, int horizons, FILE *out);
/* E_q, E_qd, E_qdd of reconstruction alone. */
int measure_chart(const struct predictor *p, const struct motion *d, FILE *out);
/* Rope and cloth: the first trajectory at five instants, 0 to its end, as lines `path true|predicted MS x y z x y z ..` of all
   beads, mm. */
int measure_path(const struct predictor *p, const struct motion *d, FILE *out);

/* ---- config.c: RO-LNN and its relatives, a model for each row of configs.h ---- */

enum { BLOCK = 16 };                    /* windows together, as ROLN_BLOCK is without an option */

/* A model: its sizes and its functions, which get `size` bytes of memory, zero or with the model's numbers, `self`. Latent states
   s [2n] are z, zd. */
struct config {
    const char *name;
    const roln_model *md;
    size_t size, scale, dt, theta;      /* of the memory; where numbers are in it */
    int N, n, params, front, packed;    /* front: parameters of the autoencoder, the first of all; packed: bytes */
    int blocks;                         /* those of the parameters; of a model that only predicts there is no more */
    const roln_block *table;
    roln_status (*encode)(void *self, const roln_real *q, const roln_real *qd, roln_real *s);
    /* z: z, zd, zdd */
    roln_status (*encode_reference)(void *self, const roln_real *q, const roln_real *qd, const roln_real *qdd, roln_real *z);
    roln_status (*decode)(void *self, const roln_real *s, roln_real *q, roln_real *qd);
    roln_status (*step)(void *self, roln_real *s, const roln_real *tau, double h);
    roln_status (*reduce)(void *self, const roln_real *z, const roln_real *tau, roln_real *tau_z);
    roln_status (*terms)(void *self, const roln_real *s, const roln_dynamics_out *out); /* all but d */
    void (*jets)(void *self, const roln_real *z, roln_real *qdd); /* qdd of z, zd, zdd in units of the networks */
    roln_status (*zdd)(void *self, const roln_real *s, const roln_real *tau_z, roln_real *zdd); /* all in units of the networks */
    roln_status (*errors)(void *self, const roln_batch *b, double dt, int every, const roln_real *qbar, roln_error *e);
    /* BLOCK states s0 [2][BLOCK][n], forces tau [BLOCK][N], both in units of the networks, steps ahead */
    void (*block)(void *self, const roln_real *s0, const roln_real *tau, double dt, int steps);
    void (*pack)(const void *self, unsigned char *bytes);
    roln_status (*open)(void *self, int count, const unsigned char *bytes); /* stored small: bytes of the full model */
    roln_status (*range)(void *self, int count, const roln_real *q, const roln_real *qd);
    roln_status (*init)(void *self, int count, const roln_real *q, const roln_real *qd, double zoom, uint64_t seed);
    void (*forget)(void *self);         /* the moments of Adam */
    roln_status (*adam)(void *self, const roln_loss *weights, const roln_batch *b, double dt, const roln_opt *opt, double *loss,
                        double *seen);
    void (*row)(void *self, const roln_loss *weights, const roln_batch *b, double dt, uint64_t seed, roln_real *J, roln_real *r);
    /* of polynomials only: a row that holds the scale of M, and the weights of a ridge, of the parameters behind the autoencoder */
    void (*hold)(void *self, roln_real *J, roln_real *r);
    void (*ridge)(void *self, roln_real *w);
    roln_real (*weigh)(void *self, const roln_batch *b);
    roln_real (*loss)(void *self, const roln_loss *weights, const roln_batch *b, roln_real *g);
    /* of charts only; b NULL: the encoder stays */
    roln_status (*chart)(void *self, const roln_batch *b, int (*more)(void *ctx, int steps, double left), void *ctx, int count,
                         const roln_real *q, double *left);
};

/* ---- model.c: what these models are to the rest ---- */

enum { STAGE_AE, STAGE_ACC, STAGE_ODE, STAGE_CHART, STAGE_NEWTON, STAGE_LBFGS };

/* One stage of training. AE, ACC, ODE: Riemannian Adam on the autoencoder alone, the acceleration loss, the ODE loss, rates falling
   to `fall` of their start. CHART: encoder by L-BFGS, decoder in closed form. NEWTON: recursive Gauss-Newton on the networks, rows
   of single samples (qdd) and of windows (q, qd). LBFGS: the networks, qdd of `batch` samples. */
struct stage {
    int kind;
    double part;                            /* of the seconds of its run */
    int most;                               /* updates or steps at most; 0: as many as the seconds allow */
    int batch;                              /* samples of an update, rows of a step */
    int steps, stride;                      /* steps of a window, samples of a step */
    double share;                           /* NEWTON: of the rows, of windows */
    double memory, last;                    /* NEWTON: steps that are remembered, at first and at last; 0: 8, and as at first */
    double cap;                             /* NEWTON: as roln_newton_opt; 0: as ROLN_NEWTON_OPT */
    double lr_ae, lr_net, fall;             /* lr_ae 0: autoencoder frozen */
    double w_q, w_acc, w_pos;               /* weights of reconstruction of q, of accelerations, of predicted positions */
    double w_qd, bias;                      /* ... of velocities; rate of the autoencoder's biases over lr_ae */
    double w_force;                         /* ... of inverse dynamics, in the acceleration loss */
    int smooth;                             /* half the samples of motion_smooth; 0: as recorded */
};

struct model {
    const struct config *kind;
    void *self;                             /* its memory, in which are */
    roln_scale *sc;
    roln_real *dt, *theta;
    struct newton *newton;                  /* goes from one stage NEWTON to the next */
};

/* Scales and autoencoder of rank-n POD from d, in data that are scaled to `zoom` times their usual size at the start; random
   networks. -1: no start from these data. */
int model_init(struct model *m, const struct config *kind, double zoom, const struct motion *d, uint64_t seed);
void model_restart(struct model *m, double zoom, uint64_t seed);    /* its networks alone, random */
void model_copy(struct model *to, const struct model *from);
void model_free(struct model *m);
int model_front(const struct config *kind);                           /* blocks of the autoencoder, the first of the table */
/* b, of all coordinates q [N], from a, trained on motion_project. */
int model_compose(struct model *b, const struct model *a, const struct config *whole, const struct pod *p, const roln_real *mean);
int model_save(const struct model *m, const char *path);            /* the bytes of NAME_pack */
int model_load(struct model *m, const struct config *kind, const char *path);
roln_status model_quantise(struct model *to, const struct config *kind,
                           const struct model *from); /* NAME_quantise; `from` has a range */
struct predictor model_predictor(struct model *m);

/* Its autoencoder, also under another model of the motion of z. */
enum { LATENT_MOST = 16 };              /* largest n */
roln_status model_encode(void *model, const roln_real *q, const roln_real *qd, roln_real *s);    /* as in struct predictor */
roln_status model_decode(void *model, const roln_real *s, roln_real *q, roln_real *qd);
/* z [3n] = z, zd, zdd and tau_z [n] in the network's units; qdd, tau may be NULL: then zdd, tau_z are not written. */
roln_status model_latent(struct model *m, const roln_real *q, const roln_real *qd, const roln_real *qdd, const roln_real *tau,
                         roln_real *z, roln_real *tau_z);
/* qdd = J zdd + (dJ/dt) zd of z [3n]. */
void model_lift(struct model *m, const roln_real *z, roln_real *qdd);

/* ---- newton.c: recursive Gauss-Newton for all that has networks ---- */

double cpu_seconds(void);               /* of this process */

/* The rows of a step: single samples that have a central difference, and windows of steps * stride samples. */
struct picks {
    int *single, *longer, singles, windows;     /* where they may begin */
    int *start, *window;                        /* [rows]: where each begins, and is it a window? */
    uint64_t signs;                             /* those of row k are drawn from signs + k */
    double factor;                              /* of the rows of windows */
};
void picks_open(struct picks *p, const struct motion *d, const struct stage *s);
void picks_close(struct picks *p);
void picks_draw(struct picks *p, int count, double share, uint64_t *seed);

/* draw: choose `count` rows, of `share` windows. rows: of these from .. from + count - 1 at x, residuals r, not finite where there
   is none, and unless NULL their derivatives J, of the model. ridge [params]: weights of a ridge, in parts of the sum of squares of
   the residuals; NULL: none. */
struct newton_task {
    void *self;
    void (*draw)(void *self, int count, double share, uint64_t *seed);
    void (*rows)(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r);
    roln_real *ridge;
};
/* Factor that makes the rows of windows three times as large as those of single samples, in the middle of a hundred of each; 1 if
   the stage has one kind alone. */
double newton_balance(const struct newton_task *task, const struct stage *s, const roln_real *x, uint64_t seed);

struct newton;
struct newton *newton_new(int blocks, const roln_block *table, int rows);
void newton_free(struct newton *n);
/* Steps until `seconds` are over, at most s->most unless 0, or until twenty in a row are not taken. x [params]. Returns the number
   of steps, -1 if none was ever taken. A later call goes on from what n knows. */
int newton_run(struct newton *n, const struct newton_task *task, const struct stage *s, roln_real *x, double seconds,
               uint64_t seed);
/* x = the mean of the last iterates, of a product of Euclidean blocks; else x stays. */
void newton_mean(const struct newton *n, roln_real *x);

/* ---- train.c: stages of training ---- */

/* One stage that lasts so many seconds. Adds to *samples the number of samples that gradients were taken of. -1: it failed. */
int model_train(struct model *m, const struct motion *d, const struct stage *stage, double seconds, uint64_t seed, double *samples);
/* The rows of a stage NEWTON of its networks. */
struct newton_task *model_task(const struct model *m, const struct motion *d, const struct stage *s, double *samples);
void model_task_free(struct newton_task *task);
void model_finish(struct model *m);     /* after the last one: of Gauss-Newton the mean of the last iterates */

/* ---- mechanics.c: learned mass, forces and potential against MuJoCo's, as `error M VALUE` .., percent, on the motion d;
   `failed mechanics VALUE`: poses that the model refused ---- */

int mechanics(struct model *m, const struct motion *d, FILE *out);

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
struct latent;
/* Random; steep: factor of the weights by z. NULL: no such. */
struct latent *latent_new(enum latent_kind kind, int n, int forced, double steep, uint64_t seed);
void latent_free(struct latent *m);
int latent_params(const struct latent *m);
roln_real *latent_theta(struct latent *m);
/* sd [2n] = d/dt of s = [z; zd] under tau_z [n] (NULL: 0). */
roln_status latent_rate(const struct latent *m, const roln_real *s, const roln_real *tau_z, roln_real *sd);
/* gs [2n] = gradient of <bar, sd> by s, gtheta += that by the parameters (may be NULL). */
roln_status latent_bwd(const struct latent *m, const roln_real *s, const roln_real *tau_z, const roln_real *bar, roln_real *gs,
                       roln_real *gtheta);
/* COMET's loss has terms beside the rate's: with random signs, their sum at s, where s' was measured as sd, and its gradient, added
   to gtheta unless NULL. 0 of the others. */
roln_real latent_extra(const struct latent *m, const roln_real *s, const roln_real *tau_z, const roln_real *sd, uint64_t *signs,
                       roln_real *gtheta);
/* Its own energy, or what it takes for one; returns 0 if it has none. */
int latent_energy(const struct latent *m, const roln_real *s, double *E);

/* ---- baseline.c: the autoencoder of one model, the motion of z of another ---- */

struct baseline {
    struct model *model;
    struct latent *latent;
    struct newton *newton;
    roln_block table;
};
/* A stage NEWTON of b->latent from the motion d in the latent space of b->model. */
int baseline_train(struct baseline *b, enum latent_kind kind, const struct motion *d, const struct stage *stage, double seconds,
                   uint64_t seed, double *samples);
/* Its rows; NULL: the autoencoder refuses d. */
struct newton_task *baseline_task(struct baseline *b, const struct motion *d, const struct stage *s, double *samples);
void baseline_task_free(struct newton_task *task);
void baseline_finish(struct baseline *b);
struct predictor baseline_predictor(struct baseline *b);        /* integrates with RK4 */

/* ---- opinf.c: Lagrangian operator inference in POD coordinates ---- */

struct opinf;
/* affine 0: as published (Sharma and Kramer 2024): q = W z uncentred, zdd + K z = W^T tau, K positive semi-definite;
   1: the stronger form, centred, zdd + C zd + K z - f = W^T tau, K and C positive semi-definite. */
int opinf_fit(struct opinf **o, int affine, int n, const struct motion *train);
void opinf_free(struct opinf *o);
int opinf_params(const struct opinf *o);
struct predictor opinf_predictor(struct opinf *o);      /* integrates with the variational midpoint rule */

/* ---- fit.c: no model; what a test set whose trajectories differ in two numbers asks for ---- */

/* `E_q whole`, percent, of every sample as a quadratic polynomial of the start's two leading POD coordinates. */
int fit_measure(const struct motion *train, const struct motion *test, FILE *out);

#endif
