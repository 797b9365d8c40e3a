/* SPDX-License-Identifier: MIT */
/* belt.c - from a logger to a loop: three links, two motors, a belt that stretches, encoders of 14 bits, torques that act 5 ms
   late, joints that stick, a payload that no recording had. Learned from recordings, then led along references that no recording
   followed.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. -Iexamples examples/belt.c -o belt -lm
   ./belt                     the closed loops, with belt_weights.h and belt_limits.h
   ./belt record > belt.csv   40 recordings of 5 s, of which train.c (-DMODEL=belt) makes these two, in three minutes on two cores:
   ./train belt.csv torque=1 delay=auto steps=60 out=belt_first
   ./train belt.csv torque=1 delay=0.0053 smoother=belt_first.roln steps=150
   ./belt tune                gains of the two laws beside it: the best of a grid

   Beside the learned model: PID, and the law of computed torque with the true M, C, g and friction. Both have the best gains of a
   grid, and see the same encoders, by a tracking filter for each joint. The table has the rms errors of the joints that have
   motors.

   1 the machine     2 references     3 recordings     4 closed loops */

#include <stdio.h>
#include <string.h>
#include "belt_plant.h"
#include "belt_tick.h" /* what runs in the controller */

enum { N = belt_N, DELAY = 5 };
static const double middle[MOTORS] = {0.8, -1.3}, reach[MOTORS] = {0.6, 0.7}; /* rad */

/* ---- 1 the machine ---------------------------------------------------------------------------- */

/* The machine, and torques on their way to it. */
typedef struct {
    motion s;
    double sent[DELAY + 1][MOTORS];
} machine;

static void start_at(machine *m, const double q[N], double payload)
{
    static const machine zero;
    *m = zero;
    memcpy(m->s.q, q, sizeof m->s.q);
    m->s.payload = payload;
}

static void read_encoders(const machine *m, int count[N])
{
    for (int i = 0; i < N; i++)
        count[i] = (int)floor(m->s.q[i] / (double)TURN * STEPS + 0.5);
}

static double clipped(int motor, double tau)
{
    return fmin(fmax(tau, -(double)most[motor]), (double)most[motor]);
}

/* A tick: this torque is sent, that of five ticks ago acts. */
static void play(machine *m, const double tau[MOTORS])
{
    enum { PARTS = 10 };
    for (int i = 0; i < MOTORS; i++)
        m->sent[DELAY][i] = clipped(i, tau[i]);
    for (int k = 0; k < PARTS; k++)
        advance(&m->s, m->sent[0], (double)TICK / PARTS);
    memmove(m->sent[0], m->sent[1], sizeof m->sent - sizeof m->sent[0]);
}

/* A tracking filter of a joint: position and velocity. */
static void track(double pole, int count, double x[2])
{
    const double e = (double)(TURN / STEPS) * count - x[0] - x[1] * (double)TICK;
    x[0] += x[1] * (double)TICK + (1 - pole * pole) * e, x[1] += (1 - pole) * (1 - pole) / (double)TICK * e;
}

/* ---- 2 references ----------------------------------------------------------------------------- */

/* The joints with motors: three sines of .1 Hz to `fastest` about the middle, grown from rest there in 2 s. The third link is
   level. */
enum { SINES = 3 };
typedef struct {
    double size[MOTORS][SINES], rate[MOTORS][SINES], phase[MOTORS][SINES];
} reference;

static reference reference_of(double part, double fastest, uint64_t *seed)
{
    reference r;
    for (int i = 0; i < MOTORS; i++)
        for (int k = 0; k < SINES; k++) {
            r.size[i][k] = part * reach[i] / SINES * (0.5 + 0.5 * (double)roln_uniform(seed));
            r.rate[i][k] = (double)TURN * (0.1 + (fastest - 0.1) * (double)roln_uniform(seed));
            r.phase[i][k] = (double)(TURN * roln_uniform(seed));
        }
    return r;
}

typedef struct {
    double q[N], qd[N], qdd[N];
} place;

static place reference_at(const reference *r, double t)
{
    place p = {{0}, {0}, {0}};
    double *const q = p.q, *const qd = p.qd, *const qdd = p.qdd;
    const double u = t < 2 ? t / 2 : 1, on = u * u * u * (10 - 15 * u + 6 * u * u);
    const double ond = t < 2 ? 15 * u * u * (1 - u) * (1 - u) : 0, ondd = t < 2 ? 15 * u * (1 - u) * (1 - 2 * u) : 0;
    for (int i = 0; i < MOTORS; i++) {
        double x = 0, xd = 0, xdd = 0;
        for (int k = 0; k < SINES; k++) {
            const double a = r->size[i][k], w = r->rate[i][k], at = w * t + r->phase[i][k];
            x += a * sin(at), xd += a * w * cos(at), xdd -= a * w * w * sin(at);
        }
        q[i] = middle[i] + on * x, qd[i] = on * xd + ond * x, qdd[i] = on * xdd + 2 * ond * xd + ondd * x;
        q[2] -= q[i], qd[2] -= qd[i], qdd[2] -= qdd[i];
    }
    return p;
}

/* ---- 3 recordings ----------------------------------------------------------------------------- */

/* Soft PD, which needs no model, leads the arm, wider and faster than it will be asked for. Columns: what the encoders count, and
   the torques that were sent. */
static void record(void)
{
    static const double kp[MOTORS] = {120, 40}, kd[MOTORS] = {16, 5}, hold[MOTORS] = {14, 6};
    enum { RECORDINGS = 40, SAMPLES = 5000 };
    uint64_t seed = 1;
    printf("t,q1,q2,q3,tau1,tau2,tau3\n");
    for (int recording = 0; recording < RECORDINGS; recording++) {
        const reference r = reference_of(1.5, 1, &seed);
        const place first = reference_at(&r, 0);
        double x[N][2] = {{0}};
        machine m;
        start_at(&m, first.q, 0);
        for (int i = 0; i < N; i++)
            x[i][0] = first.q[i];
        for (int k = 0; k < SAMPLES; k++) {
            const place p = reference_at(&r, k * (double)TICK);
            double tau[MOTORS];
            int count[N];
            read_encoders(&m, count);
            for (int i = 0; i < MOTORS; i++) {
                track(0.8, count[i], x[i]);
                tau[i] = clipped(i, hold[i] + kp[i] * (p.q[i] - x[i][0]) + kd[i] * (p.qd[i] - x[i][1]));
            }
            printf("%.3f", k * (double)TICK);
            for (int i = 0; i < N; i++)
                printf(",%.6f", (double)(TURN / STEPS) * count[i]);
            printf(",%.4f,%.4f,0\n", tau[0], tau[1]);
            play(&m, tau);
        }
        printf("\n");
    }
}

/* ---- 4 closed loops --------------------------------------------------------------------------- */

enum { PID, TRUE_MODEL, LEARNED, LAWS };

typedef struct {
    double speed, damping, integral; /* rad/s; part of critical damping; 1/s */
} gains;

static const gains best[2] = {{23.9, 0.35, 8}, {49.5, 0.96, 0}};

typedef struct {
    double rms[MOTORS], all, worst, chatter; /* rad; Nm, rms of the torque's second difference */
    uint32_t faults, seen; /* bits of guard and filter */
} errors;

/* The law's torques: PID, or computed torque, M (qdd_ref + feedback) + c + g + friction, of the true machine without payload. now:
   the reference that the encoders are compared with; then: that of the time at which the torque acts. */
static void law_torque(int law, const gains *g, double x[N][2], const place *now, const place *then, double sum[MOTORS],
                       double tau[MOTORS])
{
    static const double hold[MOTORS] = {14, 6}, inertia[MOTORS] = {1.6, 0.53};
    double M[N][N], bias[N], a[N] = {0};
    motion s = {{0}, {0}, 0};
    for (int i = 0; i < N; i++)
        s.q[i] = x[i][0], s.qd[i] = x[i][1];
    dynamics(&s, M, bias);
    for (int i = 0; i < MOTORS; i++) {
        const double e = now->q[i] - x[i][0], ed = now->qd[i] - x[i][1];
        sum[i] += g->integral * g->speed * g->speed * e * (double)TICK;
        a[i] = g->speed * g->speed * e + 2 * g->damping * g->speed * ed + sum[i];
        tau[i] = hold[i] + inertia[i] * a[i];
        a[i] += then->qdd[i];
    }
    if (law == PID) return;
    /* the third joint moves as it is driven: row 3 of M qdd + bias + friction = 0 */
    a[2] = -(bias[2] + link_of[2].friction * s.qd[2] + M[2][0] * a[0] + M[2][1] * a[1]) / M[2][2];
    for (int i = 0; i < MOTORS; i++) {
        tau[i] = bias[i] + link_of[i].friction * then->qd[i] + link_of[i].dry * tanh(then->qd[i] / 0.02);
        for (int j = 0; j < N; j++)
            tau[i] += M[i][j] * a[j];
    }
}

static errors loop(int law, const gains *g, const reference *r, double payload)
{
    enum { TICKS = 10000, FROM = 2000 };
    static controller c; /* RAM */
    errors e = {{0}, 0, 0, 0, 0, 0};
    const place first = reference_at(r, 0);
    double x[N][2], sum[MOTORS] = {0}, before[2][MOTORS] = {{0}};
    machine m;
    start_at(&m, first.q, payload);
    for (int i = 0; i < N; i++)
        x[i][0] = first.q[i], x[i][1] = 0;
    controller_start(&c);
    for (int k = 0; k < TICKS; k++) {
        const place now = reference_at(r, k * (double)TICK), then = reference_at(r, (k + DELAY) * (double)TICK);
        double tau[MOTORS];
        int count[N];
        for (int i = 0; i < MOTORS && k >= FROM; i++) {
            const double d = m.s.q[i] - now.q[i];
            e.rms[i] += d * d / (TICKS - FROM), e.worst = fmax(e.worst, fabs(d));
        }
        read_encoders(&m, count);
        if (law == LEARNED) {
            roln_real ref[N], refd[N], refdd[N];
            for (int i = 0; i < N; i++)
                ref[i] = (roln_real)then.q[i], refd[i] = (roln_real)then.qd[i], refdd[i] = (roln_real)then.qdd[i];
            e.faults |= controller_tick(&c, count, ref, refd, refdd);
            if (k > 0) e.seen |= c.seen; /* the filter starts in the first tick */
            for (int i = 0; i < MOTORS; i++)
                tau[i] = (double)c.guard.tau[i];
        } else {
            for (int i = 0; i < N; i++)
                track(0.8, count[i], x[i]);
            law_torque(law, g, x, &now, &then, sum, tau);
        }
        for (int i = 0; i < MOTORS && k >= FROM; i++)
            e.chatter += pow(tau[i] - 2 * before[0][i] + before[1][i], 2) / (TICKS - FROM);
        memcpy(before[1], before[0], sizeof before[0]), memcpy(before[0], tau, sizeof before[0]);
        play(&m, tau);
    }
    for (int i = 0; i < MOTORS; i++)
        e.all += e.rms[i] / MOTORS, e.rms[i] = sqrt(e.rms[i]);
    e.all = sqrt(e.all), e.chatter = sqrt(e.chatter);
    return e;
}

/* The gains of a grid whose mean square error over two references, without and with payload, is least. */
static gains tuned(int law)
{
    gains found = {0, 0, 0};
    double least = HUGE_VAL;
    for (double speed = 8; speed < 70; speed *= 1.2)
        for (double damping = 0.25; damping < 2; damping *= 1.4)
            for (double integral = 0.125; integral < 20; integral *= 2) {
                const gains g = {speed, damping, law == PID ? integral : 0};
                uint64_t seed = 2026;
                double all = 0;
                for (int k = 0; k < 2; k++) {
                    const reference r = reference_of(1, 0.7, &seed);
                    for (int loaded = 0; loaded < 2 && all < least; loaded++) {
                        const errors e = loop(law, &g, &r, loaded);
                        all += isfinite(e.all) ? e.all * e.all : HUGE_VAL;
                    }
                }
                if (all < least) least = all, found = g;
                if (law != PID) break;
            }
    return found;
}

int main(int argc, char **argv)
{
    static const char *const name[LAWS] = {"PID", "true model", "learned model"};
    uint64_t seed = 2027; /* gains were chosen with 2026 */
    if (argc > 1 && strcmp(argv[1], "record") == 0) return record(), 0;
    for (int law = 0; law < LEARNED && argc > 1 && strcmp(argv[1], "tune") == 0; law++) {
        const gains g = tuned(law);
        printf("%-11s speed %.3g rad/s, damping %.3g, integral %.3g /s\n", name[law], g.speed, g.damping, g.integral);
    }
    if (argc > 1) return 0;
    printf("flash: weights %u bytes    RAM: controller %u bytes\n\n", (unsigned)sizeof belt_weights, (unsigned)sizeof(controller));
    printf("mrad, and Nm of chatter: rms         joint 1       2      all   largest   chatter  faults  filter\n");
    for (int number = 1; number <= 3; number++) {
        const reference r = reference_of(1, 0.7, &seed);
        for (int loaded = 0; loaded < 2; loaded++)
            for (int law = 0; law < LAWS; law++) {
                const errors e = loop(law, law < LEARNED ? &best[law] : NULL, &r, loaded);
                printf("reference %d, %s %-14s", number, loaded ? "payload" : "empty  ", name[law]);
                for (int i = 0; i < MOTORS; i++)
                    printf("%8.2f", 1e3 * e.rms[i]);
                printf("%9.2f%10.2f%10.3f%8u%8u\n", 1e3 * e.all, 1e3 * e.worst, e.chatter, (unsigned)e.faults, (unsigned)e.seen);
            }
    }
    return 0;
}
