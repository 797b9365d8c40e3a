/* SPDX-License-Identifier: MIT */
/* arm.c - an arm of six joints from its recordings alone: learned, then led along references that no recording followed.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/arm.c -o arm -lm
   ./arm                    the closed loops, with arm_weights.h
   ./arm record > arm.csv   100 recordings of 3 s, of which train.c (-DMODEL=arm) makes these weights, a minute on two cores:
   ./train arm.csv torque=1 smooth=40 steps=200 start=random force=0 inertia=1
   README trains with torque=1 steps=100 alone, which takes less time. That model is about as good in the closed loops. The settings
   above stay, because the tests train arm_weights.h again and compare all bits.

   12-bit encoders on the joints, 1 kHz, a torque limit for each motor. The model knows encoder counts and torques only. Beside the
   latent controller: PD at the same gains, and the same law with the true M, C, g and friction of the machine. All three see the
   same encoders through the same filter, that on the learned model, so that what differs is the law.

   1 the machine     2 references     3 recordings     4 closed loops */

#include <stdio.h>
#include "arm_plant.h"
#include "arm_tick.h" /* what runs in the controller */

enum { N = arm_N };
static const double middle[N] = {0, 0, -0.75, 0, 0, 0}, reach[N] = {1.5, 0.9, 1, 1.5, 1.2, 1.5}; /* rad */

/* ---- 1 the machine ---------------------------------------------------------------------------- */

static void read_encoders(const motion *s, int count[N])
{
    for (int i = 0; i < N; i++)
        count[i] = (int)floor(s->q[i] / (double)TURN * STEPS + 0.5);
}

/* A tick under these torques. */
static void play(motion *s, const roln_real tau[N])
{
    double torque[N];
    for (int i = 0; i < N; i++)
        torque[i] = (double)tau[i];
    advance(s, torque, (double)TICK);
}

/* ---- 2 references ----------------------------------------------------------------------------- */

/* Every joint: three sines of .1 to .7 Hz about its middle, grown from rest there in 2 s. */
enum { SINES = 3 };
typedef struct { double size[N][SINES], rate[N][SINES], phase[N][SINES]; } reference;

static reference reference_of(double part, double fastest, uint64_t *seed)
{
    reference r;
    for (int i = 0; i < N; i++)
        for (int k = 0; k < SINES; k++) {
            r.size[i][k] = part * reach[i] / SINES * (0.5 + 0.5 * (double)roln_uniform(seed));
            r.rate[i][k] = (double)TURN * (0.1 + (fastest - 0.1) * (double)roln_uniform(seed));
            r.phase[i][k] = (double)(TURN * roln_uniform(seed));
        }
    return r;
}

static void reference_at(const reference *r, double t, roln_real q[N], roln_real qd[N], roln_real qdd[N])
{
    const double u = t < 2 ? t / 2 : 1, on = u * u * u * (10 - 15 * u + 6 * u * u);
    const double ond = t < 2 ? 15 * u * u * (1 - u) * (1 - u) : 0, ondd = t < 2 ? 15 * u * (1 - u) * (1 - 2 * u) : 0;
    for (int i = 0; i < N; i++) {
        double x = 0, xd = 0, xdd = 0;
        for (int k = 0; k < SINES; k++) {
            const double a = r->size[i][k], w = r->rate[i][k], at = w * t + r->phase[i][k];
            x += a * sin(at), xd += a * w * cos(at), xdd -= a * w * w * sin(at);
        }
        q[i] = (roln_real)(middle[i] + on * x);
        qd[i] = (roln_real)(on * xd + ond * x);
        qdd[i] = (roln_real)(on * xdd + 2 * ond * xd + ondd * x);
    }
}

/* ---- 3 recordings ----------------------------------------------------------------------------- */

static roln_real clipped(int i, roln_real tau)
{
    return ROLN_MAX(-most[i], ROLN_MIN(most[i], tau));
}

/* Soft PD, which needs no model, leads the arm, wider and faster than it will be asked for. */
static void record(void)
{
    const double pole = 0.8;
    enum { RECORDINGS = 100, SAMPLES = 3000, FROM = 1000 };
    uint64_t seed = 1;
    printf("t,q1,q2,q3,q4,q5,q6,qd1,qd2,qd3,qd4,qd5,qd6,tau1,tau2,tau3,tau4,tau5,tau6\n");
    for (int recording = 0; recording < RECORDINGS; recording++) {
        const reference r = reference_of(1.2, 1.5, &seed);
        double x[N], v[N] = {0}; /* of a tracking filter for each joint */
        motion s = {{0}, {0}};
        memcpy(s.q, middle, sizeof s.q), memcpy(x, middle, sizeof x);
        for (int k = 0; k < FROM + SAMPLES; k++) {
            roln_real q[N], qd[N], qdd[N], tau[N];
            int count[N];
            read_encoders(&s, count);
            reference_at(&r, k * (double)TICK, q, qd, qdd);
            for (int i = 0; i < N; i++) {
                const double e = (double)(TURN / STEPS) * count[i] - x[i] - v[i] * (double)TICK;
                x[i] += v[i] * (double)TICK + (1 - pole * pole) * e, v[i] += (1 - pole) * (1 - pole) / (double)TICK * e;
                tau[i] = clipped(i, stiff[i] / 8 * (q[i] - (roln_real)x[i]) + damp[i] / 4 * (qd[i] - (roln_real)v[i]));
            }
            if (k >= FROM) {
                printf("%.3f", (k - FROM) * (double)TICK);
                for (int i = 0; i < N; i++)
                    printf(",%.6f", (double)(TURN / STEPS) * count[i]);
                printf(",0,0,0,0,0,0"); /* qd 0: not measured */
                for (int i = 0; i < N; i++)
                    printf(",%.4f", (double)tau[i]);
                printf("\n");
            }
            play(&s, tau);
        }
        printf("\n");
    }
}

/* ---- 4 closed loops --------------------------------------------------------------------------- */

enum { PD, TRUE_MODEL, LEARNED, LAWS };

/* PD+ on the true machine: C qd_ref from what velocities take, which is quadratic in them. */
static void true_feedforward(const roln_real q[N], const roln_real qd[N], const roln_real ref[N], const roln_real acc[N],
                             roln_real tau[N])
{
    static const double none[N];
    double x[N], v[N], r[N], both[N], a[N], with_v[N], with_r[N], with_both[N];
    for (int i = 0; i < N; i++)
        x[i] = (double)q[i], v[i] = (double)qd[i], r[i] = (double)ref[i], both[i] = v[i] + r[i], a[i] = (double)acc[i];
    inverse(x, v, none, 0, with_v);
    inverse(x, r, none, 0, with_r);
    inverse(x, both, none, 0, with_both);
    inverse(x, none, a, GRAVITY, a);
    for (int i = 0; i < N; i++)
        tau[i] = (roln_real)(a[i] + (with_both[i] - with_v[i] - with_r[i]) / 2 + link_of[i].friction * v[i]);
}

typedef struct { double rms[N], all, worst; uint32_t faults, seen; } errors; /* of joints, after 2 s; bits of guard and filter */

static errors loop(int law, const reference *r)
{
    enum { TICKS = 10000, FROM = 2000 };
    static controller c; /* RAM */
    errors e = {{0}, 0, 0, 0, 0};
    motion s = {{0}, {0}};
    memcpy(s.q, middle, sizeof s.q);
    memset(&c, 0, sizeof c);
    for (int k = 0; k < TICKS; k++) {
        roln_real q[N], qd[N], qdd[N];
        int count[N];
        reference_at(r, k * (double)TICK, q, qd, qdd);
        for (int i = 0; i < N && k >= FROM; i++) {
            const double d = s.q[i] - (double)q[i];
            e.rms[i] += d * d / (TICKS - FROM), e.worst = fmax(e.worst, fabs(d));
        }
        read_encoders(&s, count);
        if (law == LEARNED) {
            e.faults |= controller_tick(&c, count, q, qd, qdd);
        } else {
            roln_real *tau = c.guard.tau;
            if (!observe(&c, count, tau)) e.faults |= ROLN_FAULT_STATUS;
            memset(tau, 0, sizeof c.guard.tau);
            if (law == TRUE_MODEL) true_feedforward(c.x.q, c.x.qd, qd, qdd, tau);
            for (int i = 0; i < N; i++)
                tau[i] = clipped(i, tau[i] + stiff[i] * (q[i] - c.x.q[i]) + damp[i] * (qd[i] - c.x.qd[i]));
        }
        if (k > 0) e.seen |= c.seen; /* the filter starts in the first tick */
        play(&s, c.guard.tau);
    }
    for (int i = 0; i < N; i++)
        e.all += e.rms[i] / N, e.rms[i] = sqrt(e.rms[i]);
    e.all = sqrt(e.all);
    return e;
}

int main(int argc, char **argv)
{
    static const char *const name[LAWS] = {"PD", "true model", "learned model"};
    uint64_t seed = 2027; /* gains and training were chosen with 2026 */
    if (argc > 1 && strcmp(argv[1], "record") == 0) return record(), 0;
    printf("flash: weights %u bytes    RAM: controller %u bytes\n\n", (unsigned)sizeof arm_weights, (unsigned)sizeof(controller));
    printf("rms error, mrad           joint 1       2       3       4       5       6      all   largest  faults  filter\n");
    for (int number = 1; number <= 3; number++) {
        const reference r = reference_of(0.8, 0.7, &seed);
        for (int law = 0; law < LAWS; law++) {
            const errors e = loop(law, &r);
            printf("reference %d %-14s", number, name[law]);
            for (int i = 0; i < N; i++)
                printf("%8.2f", 1e3 * e.rms[i]);
            printf("%9.2f%10.2f%8u%8u\n", 1e3 * e.all, 1e3 * e.worst, (unsigned)e.faults, (unsigned)e.seen);
        }
    }
    return 0;
}
