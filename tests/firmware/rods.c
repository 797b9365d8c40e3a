/* SPDX-License-Identifier: MIT */
/* rods.c - the machine of adapt.c (rods.h) against the chain of chain_plant.h, and rods of other masses against the conservation of
   energy, under torques that stay against their work, tau (q - q at the start). */
#include "chain_plant.h"
#include "rods.h"

static const float even[chain_N] = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f};
static const float uneven[chain_N] = {0.1f, 0.2f, 0.05f, 0.1f, 0.12f, 0.12f, 0.12f, 0.3f};

/* From the places of the middles, with q, qd alone. */
static double energy(const rods *s)
{
    chain_state x;
    double a = 0, ad = 0, vx = 0, vy = 0, y = 0, E = 0;
    rods_read(s, &x);
    for (int i = 0; i < chain_N; i++) {
        a += (double)x.q[i], ad += (double)x.qd[i];
        for (int half = 0; half < 2; half++) {
            vx += 0.05 * cos(a) * ad, vy += 0.05 * sin(a) * ad, y -= 0.05 * cos(a);
            if (half == 0) E += (double)uneven[i] * ((vx * vx + vy * vy) / 2 + 9.81 * y + 0.01 / 24 * ad * ad);
        }
    }
    return E;
}

static int far(double a, double b, double most)
{
    return !(fabs(a - b) <= most);
}

int main(void)
{
    uint64_t seed = 1;
    int bad = 0;
    for (float a = -6.3f; a < 6.3f; a += 0.01f) {
        float c, s;
        rods_direction(a, &c, &s);
        bad += far((double)c, cos((double)a), 3e-6) + far((double)s, sin((double)a), 3e-6);
    }
    for (int t = 0; t < 100; t++) {
        motion m;
        rods r, h, driven;
        chain_state from, to;
        float tau[chain_N];
        double work = 0;
        double zdd[2], E;
        float got[2];
        for (int i = 0; i < 2; i++) {
            r.z[i] = 1.4f * roln_uniform(&seed) - 0.7f, r.zd[i] = 2 * roln_uniform(&seed) - 1;
            m.z[i] = (double)r.z[i], m.zd[i] = (double)r.zd[i];
        }
        h = driven = r, E = energy(&h);
        for (int i = 0; i < chain_N; i++)
            tau[i] = 0.2f * roln_uniform(&seed) - 0.1f;
        rods_read(&driven, &from);
        acceleration(&m, zdd);
        rods_accelerate(&r, even, NULL, got);
        for (int i = 0; i < 2; i++) bad += far((double)got[i], zdd[i], 3e-6 * (1 + fabs(zdd[0]) + fabs(zdd[1])));
        for (int k = 0; k < 200; k++) {
            advance(&m, 0.005);
            rods_step(&r, even, NULL, 0.005f);
            rods_step(&h, uneven, NULL, 0.005f);
            if (k < 50) rods_step(&driven, uneven, tau, 0.005f);
        }
        for (int i = 0; i < 2; i++) bad += far((double)r.z[i], m.z[i], 5e-6);
        bad += far(energy(&h), E, 1e-5);
        rods_read(&driven, &to);
        for (int i = 0; i < chain_N; i++)
            work += (double)tau[i] * ((double)to.q[i] - (double)from.q[i]);
        bad += far(energy(&driven), E + work, 1e-5);
        for (int i = 0; i < chain_N; i++) { /* joints and their rates */
            const pose p = pose_of(&m);
            chain_state x;
            rods_read(&r, &x);
            bad += far((double)x.q[i], p.a[i] - (i ? p.a[i - 1] : 0), 5e-6);
            bad += far((double)x.qd[i], p.ad[i] - (i ? p.ad[i - 1] : 0), 1e-4);
        }
    }
    return bad > 0;
}
