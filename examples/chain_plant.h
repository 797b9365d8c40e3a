/* SPDX-License-Identifier: MIT */
/* chain_plant.h - the chain of pendulums of examples/pendulum.c and ekf.c as it really is: its surface and its motion in closed
   form, in double. The model of chain.h never sees it, only recordings. */
#ifndef CHAIN_PLANT_H
#define CHAIN_PLANT_H

#include <math.h>
#include "chain.h"

/* Rod i makes the angle a_i = q_0 + .. + q_i with the vertical. Joints 0 and 4 are free, q_0 = z_0 and q_4 = z_1; the
   three behind each follow it as q = c_0 z + c_1 z^2 + c_2 z^3. */
#define ROD 0.1  /* m, length of a rod */
#define MASS 0.1 /* kg */
#define GRAVITY 9.81
static const double follow[chain_N][3] = {{1, 0, 0}, {0.2, 0.5, 0}, {-0.2, -0.5, 0.2}, {-0.3, 0.4, -0.2},
                                          {1, 0, 0}, {0.2, -0.5, 0}, {-0.4, 0.4, 0.2}, {-0.2, 0.5, -0.2}};

typedef struct { double z[2], zd[2]; } motion; /* state of the simulation */
/* of the rods: a, da/dt, J = da/dz, (dJ/dt) zd */
typedef struct { double a[chain_N], ad[chain_N], J[chain_N][2], Jdzd[chain_N]; } pose;

static pose pose_of(const motion *s)
{
    pose p;
    for (int i = 0; i < chain_N; i++) {
        const int free = i / 4; /* the free joint that rod i follows */
        const double *c = follow[i], z = s->z[free], zd = s->zd[free];
        const double slope = c[0] + 2 * c[1] * z + 3 * c[2] * z * z, bend = 2 * c[1] + 6 * c[2] * z;
        p.a[i] = c[0] * z + c[1] * z * z + c[2] * z * z * z;
        p.ad[i] = slope * zd;
        p.Jdzd[i] = bend * zd * zd;
        p.J[i][free] = slope;
        p.J[i][1 - free] = 0;
        if (i > 0) { /* so far relative to the rod before */
            p.a[i] += p.a[i - 1];
            p.ad[i] += p.ad[i - 1];
            p.Jdzd[i] += p.Jdzd[i - 1];
            p.J[i][0] += p.J[i - 1][0];
            p.J[i][1] += p.J[i - 1][1];
        }
    }
    return p;
}

/* Mass matrix of the rods: inertia(i,j) cos(a_i - a_j). Moment of gravity on rod i: -weight(i) sin a_i. */
static double inertia(int i, int j)
{
    return MASS * ROD * ROD * (chain_N - 1 - (i > j ? i : j) + (i == j ? 1.0 / 3 : 0.5));
}

static double weight(int i)
{
    return MASS * GRAVITY * ROD * (chain_N - 1 - i + 0.5);
}

/* zdd from (J^T M J) zdd = -J^T (bias + M (dJ/dt) zd), bias_i = sum_j inertia sin(a_i - a_j) ad_j^2 + weight sin a_i. */
static void acceleration(const motion *s, double zdd[2])
{
    const pose p = pose_of(s);
    double A = 0, B = 0, C = 0, f[2] = {0, 0};
    for (int i = 0; i < chain_N; i++) {
        double moment = -weight(i) * sin(p.a[i]);
        for (int j = 0; j < chain_N; j++) {
            const double M = inertia(i, j) * cos(p.a[i] - p.a[j]);
            moment -= inertia(i, j) * sin(p.a[i] - p.a[j]) * p.ad[j] * p.ad[j] + M * p.Jdzd[j];
            A += p.J[i][0] * M * p.J[j][0];
            B += p.J[i][0] * M * p.J[j][1];
            C += p.J[i][1] * M * p.J[j][1];
        }
        f[0] += p.J[i][0] * moment;
        f[1] += p.J[i][1] * moment;
    }
    zdd[0] = (C * f[0] - B * f[1]) / (A * C - B * B);
    zdd[1] = (A * f[1] - B * f[0]) / (A * C - B * B);
}

/* One step of the classical Runge-Kutta scheme. */
static void advance(motion *s, double h)
{
    static const double at[4] = {0, 0.5, 0.5, 1}, part[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const motion start = *s;
    motion x = start;
    double zd[2] = {0, 0}, zdd[2] = {0, 0};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < 2; i++) {
            x.z[i] = start.z[i] + at[k] * h * zd[i];
            x.zd[i] = start.zd[i] + at[k] * h * zdd[i];
        }
        acceleration(&x, zdd);
        for (int i = 0; i < 2; i++) {
            zd[i] = x.zd[i];
            s->z[i] += part[k] * h * zd[i];
            s->zd[i] += part[k] * h * zdd[i];
        }
    }
}

#endif
