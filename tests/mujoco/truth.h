/* SPDX-License-Identifier: MIT */
/* truth.h - ground truth from MuJoCo 2.2.2: trajectories, energies and forces of known systems, and the true M and V.
   Every sample satisfies  M(q) qdd + c(q, qd) + dV/dq = tau.  Models are trained with tau_model, which holds from its
   sample, at k ms, to the next.
   Not thread-safe: one MuJoCo model and state per system are loaded on first use and kept. */
#ifndef TRUTH_H
#define TRUTH_H

#include <stdint.h>

enum truth_system {
    TRUTH_PEND2,         /* two rods, released at rest, tau = 0                                          */
    TRUTH_PEND2_ACT,     /* the same with one sine torque per joint                                      */
    TRUTH_PEND16,        /* 16 rods on the manifold q = phi(z), z in R^4: J^T tau = 0, tau_model = 0      */
    TRUTH_PEND16_ACT,    /* plus tau_u on joints 0,4,8,12: J^T tau = J^T tau_u, tau_model = tau_u         */
    TRUTH_PEND16_PD,     /* the same, tau_u by a PD controller of these joints along a random reference   */
    TRUTH_PEND16_NARROW, /* TRUTH_PEND16 from starts of at most .3 rad                                   */
    TRUTH_PEND16_SOFT,   /* starts of TRUTH_PEND16, couplings by MuJoCo's own equality constraints        */
    TRUTH_WAVE16,        /* the rods and starts of TRUTH_PEND16; phi, there polynomials, of sin, 1 - cos and tanh */
    TRUTH_WAVE16_SOFT,   /* starts of TRUTH_WAVE16, couplings by MuJoCo: polynomials anew for every step  */
    TRUTH_ROPE,          /* 65 beads on springs, the first pinned, released straight and tilted, tau = 0    */
    TRUTH_CLOTH,         /* 20 x 10 beads on springs and dampers fall flat on a frictionless sphere; tau: contact and
                           dampers, tau_model: its mean until the next sample                               */
    TRUTH_SYSTEMS
};

/* Independent random streams of one seed, below 2^62. Settings are chosen on TRUTH_TUNE, never on TRUTH_TEST. */
enum truth_split { TRUTH_TRAIN, TRUTH_TEST, TRUTH_TUNE, TRUTH_SPLITS };

struct truth_set {
    enum truth_system system;
    int count, samples, dof, latent; /* latent = 0: no z, zd                     */
    double dt, dt_sim;               /* s; dt = stride * dt_sim                  */
    uint64_t seed;
    char *model_xml;
    double *t, *e_kin, *e_pot;              /* [count][samples]; s, J                   */
    double *q, *qd, *qdd, *tau, *tau_model; /* [count][samples][dof]; rad, s, N m; of beads m, s, N */
    double *z, *zd;                         /* [count][samples][latent] or NULL         */
};

struct truth_report {
    double residual;  /* max |M qdd + c + dV/dq - tau|, by recursive Newton-Euler and, of grids, by inverse dynamics; N m, N */
    double force_max; /* max |tau|                                                                          */
    double ideal;     /* max |J^T (tau - tau_model)| (pend16), N m                                           */
    double energy;    /* max |E(t) - E(0) - work of tau_model| / peak kinetic energy, over the trajectories  */
    double impulse;   /* cloth: max |change of momentum - dt (tau_model + weight)| between samples, N s       */
    double q_max, qd_max;
};

const char *truth_name(enum truth_system system);
const char *truth_split_name(enum truth_split split); /* train, test, tune */
int truth_dof(enum truth_system system);
int truth_samples(enum truth_system system); /* of a whole trajectory, one per ms: pendulums 3000, rope 1000, cloth 250 */
int truth_find(const char *name, enum truth_system *system); /* 0, or -1: unknown name */

/* All functions returning int: 0, or -1 with the reason on stderr. A MuJoCo warning is an error. */
int truth_alloc(struct truth_set *s, enum truth_system system, int count, int samples);
int truth_generate(struct truth_set *s, enum truth_system system, enum truth_split split, uint64_t seed, int first, int count,
                   int samples); /* trajectories first .. first + count - 1 */
/* Pendulums at rest from starts [count][dof], their q, of which free joints count. */
int truth_generate_from(struct truth_set *s, enum truth_system system, uint64_t seed, int count, int samples, const double *starts);
void truth_free(struct truth_set *s);
int truth_check(const struct truth_set *s, struct truth_report *r);
int truth_csv(const struct truth_set *s, const char *path); /* t, q, qd, tau_model; blank line between trajectories */

/* Rope and cloth are grids of beads, columns x rows; bead b is at column b / rows, row b % rows; its neighbours by main
   springs are b - 1 and b + 1 in its column, b - rows and b + rows; by shear springs b - rows - 1 and b + rows + 1 only, as
   MuJoCo has one diagonal per cell.
   q holds three sliders per bead, bead after bead, in m from rest:
     rope    1 row; bead 0 is pinned at the origin and not in q, bead b >= 1 has q[3 b - 3 ..] = down, along y, along x;
             rest (q = 0) hangs unstretched: bead b at (0, 0, -.02 b)
     cloth   bead b has q[3 b ..] = along x, y, z; rest is flat, centred 5 cm above the sphere (radius .1, at the origin; the
             beads' radius is .005): bead b at (.02 (column - 9.5), .02 (row - 4.5), .155) */
int truth_grid(enum truth_system system, int *columns, int *rows);       /* -1: no grid */
int truth_beads(enum truth_system system, const double *q, double *xyz); /* world positions [columns rows][3] */

/* The truth that learned models are compared with; all arrays row-major. */
int truth_energy(enum truth_system system, const double *q, const double *qd, double *T, double *V);
int truth_terms_pend2(const double q[2], const double qd[2], double M[4], double c[2], double g[2]); /* M qdd + c + g = tau */
/* Of the systems of 16 joints, the second -1 of others: J = dphi/dz, 16 x 4, or NULL; J^T M J and V(phi(z)). */
void truth_phi(enum truth_system system, const double z[4], double q[16], double J[64]);
int truth_reduced(enum truth_system system, const double z[4], double M[16], double *V);

/* MuJoCo at another time step dt, by the system's integrator, along the trajectories of s: a system that MuJoCo steps and nobody
   drives, from sample 0 on. error: sqrt(sum |q - s|^2 / sum |s - mean of s|^2) over the instants that are samples. us_per_step:
   microseconds of mj_step alone, without energies (wave16_soft: and of setting its couplings); mean over the first trajectory,
   least of many timings; NULL: not measured.
   1: this step is unstable, q not finite or a warning. */
int truth_time(const struct truth_set *s, double dt, double *us_per_step, double *error);

/* A plant for closed loops: the system of TRUTH_PEND16_SOFT, couplings by MuJoCo, a force on every joint. Any number
   of plants side by side. */
struct truth_plant;
int truth_plant_open(struct truth_plant **p, const double q[16], const double qd[16]);
int truth_plant_step(struct truth_plant *p, const double tau[16]); /* 1 ms, tau held */
void truth_plant_state(const struct truth_plant *p, double q[16], double qd[16]);
void truth_plant_gravity(const struct truth_plant *p, double g[16]); /* dV/dq at its q, without the couplings */
void truth_plant_close(struct truth_plant *p);

#endif
