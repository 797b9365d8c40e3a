/* SPDX-License-Identifier: MIT */
/* arm_plant.h - the arm of examples/arm.c as it really is, in double: a column that turns, upper arm, forearm, three joints of a
   wrist. The model of arm.h never sees it, only recordings. */
#ifndef ARM_PLANT_H
#define ARM_PLANT_H

#include <math.h>

enum { JOINTS = 6 };
#define GRAVITY 9.81

/* Link i turns by q_i about an axis, 0 x, 1 y, 2 z, at a place of the link before it; its mass, where its middle lies, its inertia
   there, about x, y, z; seen at the joint: inertia of the rotor, viscous friction. m, kg, kg m^2, Nms/rad. A program may change
   them: tests/control/robust.c and alarms.c do. */
static struct {
    int axis;
    double at[3], mass, middle[3], inertia[3], rotor, friction;
} link_of[JOINTS] = {
    {2, {0, 0, 0.3}, 4, {0, 0, 0.05}, {0.02, 0.02, 0.01}, 0.3, 2},
    {1, {0, 0, 0.1}, 4, {0, 0.02, 0.2}, {0.06, 0.06, 0.006}, 0.5, 3},
    {1, {0, 0, 0.4}, 2.5, {0.17, 0, 0.01}, {0.003, 0.03, 0.03}, 0.2, 1.5},
    {0, {0.35, 0, 0}, 0.8, {0.05, 0, 0}, {0.0005, 0.0015, 0.0015}, 0.03, 0.2},
    {1, {0.1, 0, 0}, 0.5, {0.04, 0, 0}, {0.0003, 0.0006, 0.0006}, 0.03, 0.2},
    {0, {0.08, 0, 0}, 0.4, {0.05, 0.02, 0}, {0.0003, 0.0005, 0.0006}, 0.01, 0.1},
};

typedef struct { double q[JOINTS], qd[JOINTS]; } motion; /* state of the simulation */

static void cross(const double a[3], const double b[3], double c[3])
{
    for (int i = 0; i < 3; i++)
        c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

/* The links in space: places of the joints, from there to the middles, axes, and the links' own axes x, y, z as columns. */
typedef struct { double at[JOINTS][3], arm[JOINTS][3], axis[JOINTS][3], R[JOINTS][3][3]; } pose;

static pose pose_of(const double q[JOINTS])
{
    pose p;
    double R[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, at[3] = {0, 0, 0};
    for (int i = 0; i < JOINTS; i++) {
        const int x = link_of[i].axis, y = (x + 1) % 3, z = (x + 2) % 3;
        const double co = cos(q[i]), si = sin(q[i]);
        for (int k = 0; k < 3; k++) {
            const double *r = R[k], ry = r[y], rz = r[z];
            for (int j = 0; j < 3; j++)
                at[k] += r[j] * link_of[i].at[j];
            p.at[i][k] = at[k];
            p.axis[i][k] = r[x];
            R[k][y] = ry * co + rz * si;
            R[k][z] = rz * co - ry * si;
            p.arm[i][k] = 0;
            for (int j = 0; j < 3; j++) {
                p.R[i][k][j] = R[k][j];
                p.arm[i][k] += R[k][j] * link_of[i].middle[j];
            }
        }
    }
    return p;
}

/* One body's part of Newton and Euler: force and moment about its middle that give it the acceleration a and turn it so. */
static void newton(const pose *p, int i, const double w[3], const double wd[3], const double a[3], double f[3], double n[3])
{
    double Iw[3] = {0, 0, 0}, gyro[3];
    for (int k = 0; k < 3; k++)
        n[k] = 0;
    for (int j = 0; j < 3; j++) {
        double wj = 0, wdj = 0;
        for (int k = 0; k < 3; k++)
            wj += p->R[i][k][j] * w[k], wdj += p->R[i][k][j] * wd[k];
        for (int k = 0; k < 3; k++) {
            Iw[k] += p->R[i][k][j] * link_of[i].inertia[j] * wj;
            n[k] += p->R[i][k][j] * link_of[i].inertia[j] * wdj;
        }
    }
    cross(w, Iw, gyro);
    for (int k = 0; k < 3; k++)
        n[k] += gyro[k], f[k] = link_of[i].mass * a[k];
}

/* a of a point that moves with a body at r from one that has the acceleration a0. */
static void carried(const double a0[3], const double w[3], const double wd[3], const double r[3], double a[3])
{
    double wr[3], wwr[3], wdr[3];
    cross(w, r, wr), cross(w, wr, wwr), cross(wd, r, wdr);
    for (int k = 0; k < 3; k++)
        a[k] = a0[k] + wdr[k] + wwr[k];
}

/* Torques of motors that turn at qd and make qdd, without friction, by Newton and Euler: outwards how links move, inwards what
   that takes. */
static void inverse(const double q[JOINTS], const double qd[JOINTS], const double qdd[JOINTS], double gravity, double tau[JOINTS])
{
    const pose p = pose_of(q);
    double f[JOINTS][3], n[JOINTS][3], w[3] = {0, 0, 0}, wd[3] = {0, 0, 0}, a[3] = {0, 0, gravity};
    double F[3] = {0, 0, 0}, N[3] = {0, 0, 0};
    for (int i = 0; i < JOINTS; i++) {
        double r[3], at[3], middle[3], turn[3];
        for (int k = 0; k < 3; k++)
            r[k] = i > 0 ? p.at[i][k] - p.at[i - 1][k] : 0;
        carried(a, w, wd, r, at);
        cross(w, p.axis[i], turn);
        for (int k = 0; k < 3; k++) {
            a[k] = at[k];
            wd[k] += p.axis[i][k] * qdd[i] + turn[k] * qd[i];
            w[k] += p.axis[i][k] * qd[i];
        }
        carried(a, w, wd, p.arm[i], middle);
        newton(&p, i, w, wd, middle, f[i], n[i]);
    }
    for (int i = JOINTS - 1; i >= 0; i--) { /* F, N: of all outside, N about this joint */
        double r[3], lever[3], m[3];
        for (int k = 0; k < 3; k++)
            r[k] = i < JOINTS - 1 ? p.at[i + 1][k] - p.at[i][k] : 0;
        cross(r, F, lever), cross(p.arm[i], f[i], m);
        tau[i] = link_of[i].rotor * qdd[i];
        for (int k = 0; k < 3; k++) {
            N[k] += lever[k] + m[k] + n[i][k];
            F[k] += f[i][k];
            tau[i] += p.axis[i][k] * N[k];
        }
    }
}

/* Mass matrix: column j is what one rad/s^2 of joint j takes. */
static void inertia(const double q[JOINTS], double M[JOINTS][JOINTS])
{
    static const double still[JOINTS];
    for (int j = 0; j < JOINTS; j++) {
        double unit[JOINTS] = {0};
        unit[j] = 1;
        inverse(q, still, unit, 0, M[j]);
    }
}

/* qdd from M qdd = tau - friction - bias, by Cholesky's factors. */
static void acceleration(const motion *s, const double tau[JOINTS], double qdd[JOINTS])
{
    static const double none[JOINTS];
    double M[JOINTS][JOINTS], bias[JOINTS];
    inertia(s->q, M);
    inverse(s->q, s->qd, none, GRAVITY, bias);
    for (int i = 0; i < JOINTS; i++) {
        qdd[i] = tau[i] - bias[i] - link_of[i].friction * s->qd[i];
        for (int j = 0; j <= i; j++) {
            for (int k = 0; k < j; k++)
                M[i][j] -= M[i][k] * M[j][k];
            M[i][j] = i == j ? sqrt(M[i][i]) : M[i][j] / M[j][j];
        }
        for (int k = 0; k < i; k++)
            qdd[i] -= M[i][k] * qdd[k];
        qdd[i] /= M[i][i];
    }
    for (int i = JOINTS - 1; i >= 0; i--) {
        for (int k = i + 1; k < JOINTS; k++)
            qdd[i] -= M[k][i] * qdd[k];
        qdd[i] /= M[i][i];
    }
}

/* One step of the classical Runge-Kutta scheme under torques that are held. */
static void advance(motion *s, const double tau[JOINTS], double h)
{
    static const double at[4] = {0, 0.5, 0.5, 1}, part[4] = {1.0 / 6, 1.0 / 3, 1.0 / 3, 1.0 / 6};
    const motion start = *s;
    motion x = start;
    double qd[JOINTS] = {0}, qdd[JOINTS] = {0};
    for (int k = 0; k < 4; k++) {
        for (int i = 0; i < JOINTS; i++) {
            x.q[i] = start.q[i] + at[k] * h * qd[i];
            x.qd[i] = start.qd[i] + at[k] * h * qdd[i];
        }
        acceleration(&x, tau, qdd);
        for (int i = 0; i < JOINTS; i++) {
            qd[i] = x.qd[i];
            s->q[i] += part[k] * h * qd[i];
            s->qd[i] += part[k] * h * qdd[i];
        }
    }
}

#endif
