/* SPDX-License-Identifier: MIT */
/* furuta.c - a Furuta pendulum from its recordings alone: learned, swung up, caught, held upright.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/furuta.c -o furuta -lm
   ./furuta                       the closed loops, with furuta_weights.h
   ./furuta record > furuta.csv   24 recordings of 4 s, of which train.c (-DMODEL=furuta) makes these weights in seconds:
   ./train furuta.csv torque=1 smooth=20 steps=150 start=random force=0 inertia=9.765625e-4

   One motor, two joints that turn all round, 12-bit encoders, 1 kHz, and a torque limit at which a tilt of half a radian is just
   too much. The model knows encoder counts and torques only.

   1 the machine     2 recordings     3 catching     4 swinging up */

#include <stdio.h>
#include "furuta_plant.h"
#include "furuta_tick.h" /* what runs in the controller */

/* ---- 1 the machine ---------------------------------------------------------------------------- */

#define TURN 6.283185307179586

/* What an encoder says of an angle; it does not count turns. */
static int encoder(double angle)
{
    const int count = (int)floor(angle / TURN * STEPS + 0.5) % STEPS;
    return count < 0 ? count + STEPS : count;
}

/* A tick under a torque, Nm. */
static void play(motion *s, double torque)
{
    for (int i = 0; i < 2; i++)
        advance(s, torque, (double)TICK / 2);
}

/* ---- 2 recordings ----------------------------------------------------------------------------- */

/* The pendulum is let go at any angle; the motor makes sines of .5 to 4 Hz. */
static void record(void)
{
    enum { RECORDINGS = 24, SAMPLES = 4000, SINES = 3 };
    uint64_t seed = 1;
    printf("t,q1,q2,qd1,qd2,tau1,tau2\n");
    for (int recording = 0; recording < RECORDINGS; recording++) {
        motion s = {{0, TURN * (double)roln_uniform(&seed)}, {0, 0}};
        double size[SINES], rate[SINES], phase[SINES];
        for (int i = 0; i < SINES; i++) {
            size[i] = (double)(TORQUE / SINES * roln_uniform(&seed));
            rate[i] = TURN * (0.5 + 3.5 * (double)roln_uniform(&seed));
            phase[i] = TURN * (double)roln_uniform(&seed);
        }
        for (int k = 0; k < SAMPLES; k++) {
            double torque = 0;
            for (int i = 0; i < SINES; i++)
                torque += size[i] * sin(rate[i] * k * (double)TICK + phase[i]);
            printf("%.3f,%.6f,%.6f,0,0,%.7f,0\n", k * (double)TICK, TURN / STEPS * encoder(s.q[0]),
                   TURN / STEPS * encoder(s.q[1]), torque); /* qd 0: not measured */
            play(&s, torque);
        }
        printf("\n");
    }
}

/* ---- 3 catching ------------------------------------------------------------------------------- */

static controller ctl; /* RAM */

/* A tick of the loop. Returns the faults. */
static uint32_t tick(motion *s)
{
    const int count[2] = {encoder(s->q[0]), encoder(s->q[1])};
    const uint32_t faults = controller_tick(&ctl, count);
    play(s, (double)ctl.guard.tau[0]);
    return faults;
}

static double tilt(const motion *s)
{
    return fabs(remainder(s->q[1] - TURN / 2, TURN));
}

/* The gains that the same weights give for the true machine: its step, differentiated. */
static roln_status true_gains(roln_real K[4])
{
    const double h = 1e-4;
    roln_real A[16], B[4], D[16] = {1, 0, 0, 0, 0, 10, 0, 0, 0, 0, ROLN_C(0.2), 0, 0, 0, 0, 1}, C[16], work[ROLN_DARE_WORK(4, 1)];
    const roln_real r[1] = {10000};
    for (int j = 0; j <= 4; j++) {
        motion s[2];
        for (int side = 0; side < 2; side++) {
            const double d = side ? h : -h;
            motion x = {{j == 0 ? d : 0, TURN / 2 + (j == 1 ? d : 0)}, {j == 2 ? d : 0, j == 3 ? d : 0}};
            play(&x, j == 4 ? d : 0);
            s[side] = x;
        }
        for (int i = 0; i < 2; i++) {
            const roln_real dq = (roln_real)((s[1].q[i] - s[0].q[i]) / (2 * h));
            const roln_real dqd = (roln_real)((s[1].qd[i] - s[0].qd[i]) / (2 * h));
            if (j < 4) A[4 * i + j] = dq, A[4 * (2 + i) + j] = dqd;
            else B[i] = dq, B[2 + i] = dqd;
        }
    }
    return roln_dare(4, 1, A, B, D, r, C, K, work);
}

/* Held at 25 tilts up to .5 rad and let go: how many are upright after 3 s, and have not been down? */
static int catches(const roln_real *K)
{
    enum { TILTS = 25 };
    int caught = 0;
    for (int k = 0; k < TILTS; k++) {
        motion s = {{0, TURN / 2 + (k - TILTS / 2) / 24.0}, {0, 0}};
        double most = 0;
        controller_start(&ctl);
        memcpy(ctl.K, K, sizeof ctl.K);
        ctl.caught = 1;
        for (int t = 0; t < 3000; t++)
            tick(&s), most = fmax(most, tilt(&s));
        caught += most < 1 && tilt(&s) < 0.05;
    }
    return caught;
}

/* ---- 4 swinging up ---------------------------------------------------------------------------- */

static void swing_up(void)
{
    motion s = {{0, 0.01}, {0, 0}};
    controller_start(&ctl);
    printf("\nswing-up, s   arm, rad   tilt, rad   torque, mNm\n");
    for (int k = 0; k <= 2000; k++) {
        if (k % 200 == 0)
            printf("%11.1f %10.2f %11.3f %13.1f\n", k * (double)TICK, s.q[0], tilt(&s), 1e3 * (double)ctl.guard.tau[0]);
        tick(&s);
    }
}

/* From 20 poses at rest: how many are upright after 10 s, when the last one was so, and how it is held in the last 2 s. */
static void swing_ups(void)
{
    enum { POSES = 20 };
    double latest = 0, square = 0, arm = 0;
    uint32_t faults = 0;
    int held = 0;
    for (int pose = 0; pose < POSES; pose++) {
        motion s = {{0, TURN / 4 * (pose - 9.5) / 10}, {0, 0}};
        double since = 0;
        controller_start(&ctl);
        for (int k = 1; k <= 10000; k++) {
            faults |= tick(&s);
            if (tilt(&s) > 0.3) since = k * (double)TICK;
            if (k <= 8000) continue;
            square += tilt(&s) * tilt(&s) / 2000 / POSES;
            arm = fmax(arm, fabs(remainder(s.q[0], TURN)));
        }
        held += tilt(&s) < 0.05;
        latest = fmax(latest, since);
    }
    printf("\nswung up and caught from %d poses: %d, the last after %.1f s; then tilt %.2f mrad rms, arm within %.1f mrad, "
           "faults %u\n", POSES, held, latest, 1e3 * sqrt(square), 1e3 * arm, (unsigned)(faults & ~(uint32_t)ROLN_CLIPPED));
}

int main(int argc, char **argv)
{
    roln_real K[4];
    if (argc > 1 && strcmp(argv[1], "record") == 0) return record(), 0;
    printf("flash: weights %u bytes    RAM: controller %u bytes\n\n", (unsigned)sizeof furuta_weights, (unsigned)sizeof ctl);
    if (controller_start(&ctl) != ROLN_OK || true_gains(K) != ROLN_OK) return 1;
    printf("feedback, mNm     1/rad of arm, pendulum     1/(rad/s)\n");
    for (int i = 0; i < 2; i++) {
        const roln_real *of = i ? K : ctl.K;
        printf("%s %12.2f %12.2f %11.3f %11.3f\n", i ? "true matrices" : "learned      ", 1e3 * (double)of[0], 1e3 * (double)of[1],
               1e3 * (double)of[2], 1e3 * (double)of[3]);
    }
    printf("caught of 25 tilts up to 0.5 rad: true matrices %d", catches(K));
    controller_start(&ctl);
    memcpy(K, ctl.K, sizeof K);
    printf(", learned %d\n", catches(K));
    swing_up();
    swing_ups();
    return 0;
}
