/* SPDX-License-Identifier: MIT */
/* belt_plant.h - the arm of examples/belt.c as it really is, in double: three links in a vertical plane, motors at the first two
   joints, a belt that keeps the third link level. Dry friction holds a joint that stands. The model of belt.h never sees it, only
   recordings. */
#ifndef BELT_PLANT_H
#define BELT_PLANT_H

#include <math.h>

enum { JOINTS = 3, MOTORS = 2 };
#define GRAVITY 9.81

/* Links are rods: length, mass; at each joint inertia of the rotor, viscous and dry friction. m, kg, kg m^2, Nms/rad, Nm. */
static const struct {
    double length, mass, rotor, friction, dry;
} link_of[JOINTS] = {{0.4, 3, 0.1, 0.5, 0.8}, {0.35, 2, 0.05, 0.3, 0.5}, {0.2, 0.8, 0.002, 0.02, 0.03}};

#define BELT_STIFF 60 /* Nm/rad, of q1 + q2 + q3, the angle of the third link from the horizontal */
#define BELT_DAMP 0.1 /* Nms/rad */

typedef struct {
    double q[JOINTS], qd[JOINTS]; /* rad, rad/s; q1 from the horizontal, q2 and q3 from the link before */
    double payload;               /* kg, at the end of the third link */
} motion;

/* M qdd + bias = tau - friction: M [3][3], bias of velocities, gravity and belt. In angles of links from the horizontal, a = sums
   of q, M_ij = K_ij cos(a_i - a_j). K_ij: lengths up to the outer link's masses. */
static void dynamics(const motion *s, double M[JOINTS][JOINTS], double bias[JOINTS])
{
    double a[JOINTS], ad[JOINTS], beyond[JOINTS + 1], lever[JOINTS], force[JOINTS] = {0};
    for (int i = 0; i < JOINTS; i++)
        a[i] = s->q[i] + (i > 0 ? a[i - 1] : 0), ad[i] = s->qd[i] + (i > 0 ? ad[i - 1] : 0);
    beyond[JOINTS] = s->payload;
    for (int i = JOINTS - 1; i >= 0; i--) {
        lever[i] = link_of[i].length * (link_of[i].mass / 2 + beyond[i + 1]);
        beyond[i] = beyond[i + 1] + link_of[i].mass;
    }
    for (int i = 0; i < JOINTS; i++)
        for (int j = 0; j < JOINTS; j++)
            M[i][j] = 0;
    for (int i = 0; i < JOINTS; i++)
        for (int j = 0; j < JOINTS; j++) {
            const int in = i < j ? i : j, out = i < j ? j : i;
            const double l = link_of[i].length;
            const double K = i == j ? l * l * (link_of[i].mass / 3 + beyond[i + 1]) : link_of[in].length * lever[out];
            force[i] += K * sin(a[i] - a[j]) * ad[j] * ad[j];
            for (int k = 0; k <= i; k++)
                for (int m = 0; m <= j; m++)
                    M[k][m] += K * cos(a[i] - a[j]);
        }
    for (int i = 0; i < JOINTS; i++) {
        M[i][i] += link_of[i].rotor;
        bias[i] = BELT_STIFF * a[JOINTS - 1] + BELT_DAMP * ad[JOINTS - 1];
        for (int k = i; k < JOINTS; k++)
            bias[i] += force[k] + GRAVITY * lever[k] * cos(a[k]);
    }
}

/* Ainv = A^-1, of a positive definite matrix, by Gauss and Jordan. */
static void inverse(double A[JOINTS][JOINTS], double Ainv[JOINTS][JOINTS])
{
    for (int i = 0; i < JOINTS; i++)
        for (int j = 0; j < JOINTS; j++)
            Ainv[i][j] = i == j;
    for (int k = 0; k < JOINTS; k++) {
        const double pivot = A[k][k];
        for (int j = 0; j < JOINTS; j++)
            A[k][j] /= pivot, Ainv[k][j] /= pivot;
        for (int i = 0; i < JOINTS; i++) {
            const double f = A[i][k];
            for (int j = 0; j < JOINTS && i != k; j++)
                A[i][j] -= f * A[k][j], Ainv[i][j] -= f * Ainv[k][j];
        }
    }
}

/* h seconds under torques that are held. Dry friction is an impulse of at most dry * h that stops a joint if it can: what acts
   between the joints is found by ten rounds of Gauss and Seidel. */
static void advance(motion *s, const double tau[MOTORS], double h)
{
    double M[JOINTS][JOINTS], A[JOINTS][JOINTS], bias[JOINTS], free_of[JOINTS], impulse[JOINTS] = {0};
    dynamics(s, M, bias);
    for (int i = 0; i < JOINTS; i++) /* viscous friction is implicit */
        M[i][i] += h * link_of[i].friction;
    for (int i = 0; i < JOINTS; i++) {
        free_of[i] = h * ((i < MOTORS ? tau[i] : 0) - bias[i]);
        for (int j = 0; j < JOINTS; j++)
            free_of[i] += (M[i][j] - (i == j) * h * link_of[i].friction) * s->qd[j];
    }
    inverse(M, A);
    for (int round = 0; round < 10; round++)
        for (int i = 0; i < JOINTS; i++) {
            double v = 0;
            for (int j = 0; j < JOINTS; j++)
                v += A[i][j] * (free_of[j] - impulse[j]);
            impulse[i] = fmin(fmax(impulse[i] + v / A[i][i], -h * link_of[i].dry), h * link_of[i].dry);
        }
    for (int i = 0; i < JOINTS; i++) {
        s->qd[i] = 0;
        for (int j = 0; j < JOINTS; j++)
            s->qd[i] += A[i][j] * (free_of[j] - impulse[j]);
    }
    for (int i = 0; i < JOINTS; i++)
        s->q[i] += h * s->qd[i];
}

#endif
