/* SPDX-License-Identifier: MIT */
/* furuta_plant.h - the Furuta pendulum of examples/furuta.c as it really is, in double: about the size of a desk-top one. The model
   of furuta.h never sees it, only recordings. */
#ifndef FURUTA_PLANT_H
#define FURUTA_PLANT_H

#include <math.h>

/* q_0: the arm, about the vertical; q_1: the pendulum, a rod about the arm's axis, 0 hanging. The motor drives the arm alone. */
#define ARM 0.085       /* m, from the vertical to the rod */
#define TURNED 2.3e-4   /* kg m^2, of motor and arm about the vertical */
#define ROD 0.129       /* m, its length */
#define MASS 0.024      /* kg, of the rod */
#define GRAVITY 9.81
static const double viscous[2] = {4e-4, 2e-5}; /* Nms/rad */

typedef struct { double q[2], qd[2]; } motion; /* state of the simulation */

/* M = [a + b sin^2, c cos; c cos, b] of q_1; f = tau - friction - what velocities and gravity ask for. */
static void acceleration(const motion *s, double torque, double qdd[2])
{
    const double a = TURNED + MASS * ARM * ARM, b = MASS * ROD * ROD / 3, c = MASS * ARM * ROD / 2;
    const double si = sin(s->q[1]), co = cos(s->q[1]), v = s->qd[0], w = s->qd[1];
    const double M = a + b * si * si, E = c * co, D = M * b - E * E;
    const double f = torque - viscous[0] * v - 2 * b * si * co * v * w + c * si * w * w;
    const double g = b * si * co * v * v - viscous[1] * w - MASS * GRAVITY * ROD / 2 * si;
    qdd[0] = (b * f - E * g) / D;
    qdd[1] = (M * g - E * f) / D;
}

/* One step of the classical Runge-Kutta scheme under a torque that is held. */
static void advance(motion *s, double torque, double h)
{
    static const double at[4] = {0, 0.5, 0.5, 1}, part[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const motion start = *s;
    motion x = start;
    double qd[2] = {0, 0}, qdd[2] = {0, 0};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < 2; i++) {
            x.q[i] = start.q[i] + at[k] * h * qd[i];
            x.qd[i] = start.qd[i] + at[k] * h * qdd[i];
        }
        acceleration(&x, torque, qdd);
        for (int i = 0; i < 2; i++) {
            qd[i] = x.qd[i];
            s->q[i] += part[k] * h * qd[i];
            s->qd[i] += part[k] * h * qdd[i];
        }
    }
}

#endif
