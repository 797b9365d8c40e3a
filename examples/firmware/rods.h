/* SPDX-License-Identifier: MIT */
/* rods.h - the machine of adapt.c: the chain of examples/chain_plant.h in float, without libm, with rods of any mass, and with
   torques tau of the joints, in Nm; NULL: none. Rod i makes the angle a_i = q_0 + .. + q_i with the vertical; joints 0 and 4 are
   free, the three behind each follow it, q = c_0 z + c_1 z^2 + c_2 z^3. */
#ifndef RODS_H
#define RODS_H

#include "chain.h"

#define RODS_LENGTH 0.1f /* m, of one */
#define RODS_GRAVITY 9.81f
static const float rods_follow[chain_N][3] = {{1, 0, 0}, {0.2f, 0.5f, 0}, {-0.2f, -0.5f, 0.2f}, {-0.3f, 0.4f, -0.2f},
                                              {1, 0, 0}, {0.2f, -0.5f, 0}, {-0.4f, 0.4f, 0.2f}, {-0.2f, 0.5f, -0.2f}};

typedef struct { float z[2], zd[2]; } rods;

/* c + i s = exp(i a), |a| <= 2 pi to 3e-6: the series at a quarter of a, squared twice. */
static void rods_direction(float a, float *c, float *s)
{
    const float x = a / 4, y = x * x;
    float cs = 1 - y / 2 * (1 - y / 12 * (1 - y / 30 * (1 - y / 56 * (1 - y / 90))));
    float sn = x * (1 - y / 6 * (1 - y / 20 * (1 - y / 42 * (1 - y / 72 * (1 - y / 110)))));
    for (int k = 0; k < 2; k++) {
        const float twice = 2 * cs * sn;
        cs = cs * cs - sn * sn;
        sn = twice;
    }
    *c = cs;
    *s = sn;
}

/* Joint i and its rate: q, dq/dz, d2q/dz2 of the free joint that it follows. */
static void rods_joint(int i, float z, float q[3])
{
    const float *c = rods_follow[i];
    q[0] = z * (c[0] + z * (c[1] + z * c[2]));
    q[1] = c[0] + z * (2 * c[1] + z * 3 * c[2]);
    q[2] = 2 * c[1] + z * 6 * c[2];
}

static void rods_read(const rods *s, chain_state *x)
{
    for (int i = 0; i < chain_N; i++) {
        float q[3];
        rods_joint(i, s->z[i / 4], q);
        x->q[i] = q[0];
        x->qd[i] = q[1] * s->zd[i / 4];
    }
}

/* zdd, for which the sum over the rods of m J^T (J zdd + b + gravity) + I j (j zdd + bend) is (dq/dz)^T tau. The angle of a rod has
   the second derivative j zdd + bend, its middle J zdd + b; x to the side, y up. */
static void rods_accelerate(const rods *s, const float mass[chain_N], const float *tau, float zdd[2])
{
    float a = 0, ad = 0, bend = 0, j[2] = {0, 0};                    /* of the angle */
    float Jx[2] = {0, 0}, Jy[2] = {0, 0}, bx = 0, by = RODS_GRAVITY; /* of the upper end; gravity in by */
    float A = 0, B = 0, C = 0, f[2] = {0, 0};
    for (int i = 0; i < chain_N; i++) {
        const float zd = s->zd[i / 4], inertia = mass[i] * RODS_LENGTH * RODS_LENGTH / 12;
        float q[3], c, sn;
        rods_joint(i, s->z[i / 4], q);
        a += q[0], ad += q[1] * zd, bend += q[2] * zd * zd, j[i / 4] += q[1];
        rods_direction(a, &c, &sn);
        if (tau) f[i / 4] += q[1] * tau[i];
        for (int half = 0; half < 2; half++) {
            for (int k = 0; k < 2; k++) {
                Jx[k] += RODS_LENGTH / 2 * c * j[k];
                Jy[k] += RODS_LENGTH / 2 * sn * j[k];
            }
            bx += RODS_LENGTH / 2 * (c * bend - sn * ad * ad);
            by += RODS_LENGTH / 2 * (sn * bend + c * ad * ad);
            if (half == 1) continue; /* the lower end */
            A += mass[i] * (Jx[0] * Jx[0] + Jy[0] * Jy[0]) + inertia * j[0] * j[0];
            B += mass[i] * (Jx[0] * Jx[1] + Jy[0] * Jy[1]) + inertia * j[0] * j[1];
            C += mass[i] * (Jx[1] * Jx[1] + Jy[1] * Jy[1]) + inertia * j[1] * j[1];
            for (int k = 0; k < 2; k++)
                f[k] -= mass[i] * (Jx[k] * bx + Jy[k] * by) + inertia * j[k] * bend;
        }
    }
    zdd[0] = (C * f[0] - B * f[1]) / (A * C - B * B);
    zdd[1] = (A * f[1] - B * f[0]) / (A * C - B * B);
}

/* One step of the classical Runge-Kutta scheme. */
static void rods_step(rods *s, const float mass[chain_N], const float *tau, float h)
{
    static const float at[4] = {0, 0.5f, 0.5f, 1}, part[4] = {1 / 6.0f, 1 / 3.0f, 1 / 3.0f, 1 / 6.0f};
    const rods start = *s;
    float zd[2] = {0, 0}, zdd[2] = {0, 0};
    for (int k = 0; k < 4; k++) {
        rods x;
        for (int i = 0; i < 2; i++) {
            x.z[i] = start.z[i] + at[k] * h * zd[i];
            x.zd[i] = start.zd[i] + at[k] * h * zdd[i];
        }
        rods_accelerate(&x, mass, tau, zdd);
        for (int i = 0; i < 2; i++) {
            zd[i] = x.zd[i];
            s->z[i] += part[k] * h * zd[i];
            s->zd[i] += part[k] * h * zdd[i];
        }
    }
}

#endif
