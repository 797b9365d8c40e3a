/* SPDX-License-Identifier: MIT */
/* control.h - closed loops around MuJoCo's pend16: a trained model drives the chain along a reference at 1 kHz.
   Every law lifts a force on the 4 learned coordinates to the joints; they share the gains kp, kd. */
#ifndef CONTROL_H
#define CONTROL_H

#include <stdint.h>

#include "roln.h"

#define CONTROL_MODEL "tests/mujoco/models/pend16_act.roln"
#define CONTROL_POWER 3.0        /* limits of the guard: energy-rate residual, W */
#define CONTROL_TORQUE 60.0      /* N m */
#define CONTROL_OFF 0.05         /* rad off the learned manifold */
#define CONTROL_OFF_RATE 1.0     /* rad/s */
#define CONTROL_HOLD 3           /* bad ticks that are bridged */
enum { CONTROL_REFERENCES = 3 }; /* seeds 1 .. 3 */

enum control_law {
    CONTROL_PD,         /* tau = D^T (-Kp e - Kd ed), e = z - z_ref                                        */
    CONTROL_PD_GRAVITY, /* plus the plant's true gravity force at the measured q                            */
    CONTROL_LATENT,     /* tau = D^T (M zdd_ref + C zd_ref + g - Kp e - Kd ed), all of the model             */
    CONTROL_PD_4,       /* CONTROL_PD and CONTROL_LATENT with motors on joints 0, 4, 8, 12 alone: tau = B u, */
    CONTROL_LATENT_4,   /* J^T B u = tau_z                                                                   */
    CONTROL_LAWS
};

const char *control_name(enum control_law law);

/* Every free joint: a sum of three sines of .1 to .9 Hz, amplitudes adding up to .3 to .5 rad, grown from rest in 2 s. */
struct control_reference {
    double amplitude[4][3], frequency[4][3], phase[4][3];
};
struct control_reference control_reference(uint64_t seed);
void control_reference_at(const struct control_reference *r, double t, double q[16], double qd[16], double qdd[16]);

struct control_model;                                 /* a trained pend16, and a controller that uses it */
struct control_model *control_load(const char *path); /* NULL, with the reason on stderr */
void control_free(struct control_model *m);

/* kp = w^2 M_ii, kd = 2 zeta w M_ii of the model's mean M over poses within .5 rad; w in rad/s */
struct control_gains {
    roln_real kp[4], kd[4];
};
int control_gains(struct control_model *m, double w, double zeta, struct control_gains *g);

struct control_result {
    double rms, rms_free, max; /* error of the 16 joints, of the 4 free ones, largest of all; rad */
    double early, late;        /* rms error of the first and the second half after the start-up of 2 s */
    double tau;                /* rms of |tau|, N m                          */
    double outside;            /* part of the samples with z or z_ref outside the model's z_min .. z_max */
    int bad, faults;           /* ticks with a status other than ROLN_OK; with any fault */
};

/* A controller: one tick. x [5][16]: q, qd measured, q, qd, qdd of the reference; tau [16]: of the last tick in, to be applied out.
   Returns ROLN_FAULT_.., or -1: the loop ends. */
typedef int control_controller(void *ctx, const roln_real *x, roln_real *tau);

/* The controller of a law (ctx: the model), from control_start on; x NULL: a tick without measurement. */
void control_start(struct control_model *m, enum control_law law, const struct control_gains *gains);
int control_tick(void *m, const roln_real *x, roln_real *tau);
int control_encode_reference(struct control_model *m, const roln_real *x,
                             roln_real z_ref[12]); /* z, zd, zdd of the reference; not 0: failed */

/* Run for `steps` ms; gravity: the plant's own is added to tau. trace [steps][16]: measured q, or NULL. 0, or -1: the controller
   said so, or, with the reason on stderr, the plant failed. */
int control_loop(struct control_model *m, const struct control_reference *r, control_controller *tick, void *ctx, int gravity,
                 int steps, struct control_result *result, double *trace);
int control_run(struct control_model *m, const struct control_reference *r, enum control_law law, const struct control_gains *gains,
                int steps, struct control_result *result, double *trace);

/* A table on stdout; the last column is the rms error to that of pd. */
void control_heading(void);
void control_row(enum control_law law, const struct control_result *r, const struct control_result *pd);

#endif
