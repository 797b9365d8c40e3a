/* SPDX-License-Identifier: MIT */
/* robust - plans of the arm of examples/arm.c with soft limits of its joints, or of its tip by a wall, on machines whose masses,
   inertias, rotors and friction are each up to 20 % off those that the model has learned. Goals are near the limits, or beyond
   them. The program counts motions that leave the limits: by plans without limits, with limits, and with limits that are tightened
   (arm_plan_tighten).
     robust          from the top of the repository: 1,000 motions, four minutes
     robust test     100 of them

   1 machines     2 a goal     3 what the model does not know     4 closed loops */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define ROLN_PLAN 15, 6
#include "arm.h"
#include "arm_weights.h"
#include "arm_plant.h"
#include "../unit/check.h"

enum { N = arm_N, AHEAD = arm_steps };
#define OFF 0.2     /* largest relative error of a parameter */
#define WALL 0.45   /* m, before the arm: the largest x of the tip */
#define STEP 0.04   /* s, of a plan */
#define TICK 0.004  /* s, of arm_plan_follow */
static const double middle[N] = {0, 0, -0.75, 0, 0, 0}, reach[N] = {1.5, 0.9, 1, 1.5, 1.2, 1.5}; /* rad, of the recordings */

static double uniform(double low, double high, uint64_t *seed)
{
    return low + (high - low) * (double)roln_uniform(seed);
}

/* ---- 1 machines ---- */

static double known[JOINTS][6]; /* of each link: mass, inertia, rotor, friction, as the model has learned them */

static double *const *numbers_of(int i)
{
    static double *of[6];
    of[0] = &link_of[i].mass, of[1] = link_of[i].inertia, of[2] = of[1] + 1, of[3] = of[1] + 2;
    of[4] = &link_of[i].rotor, of[5] = &link_of[i].friction;
    return of;
}

/* Another machine: every number of it is off by itself, but for the inertias of a link, which are off together. */
static void another(double off, uint64_t *seed)
{
    for (int i = 0; i < JOINTS; i++) {
        const double turned = uniform(1 - off, 1 + off, seed);
        for (int k = 0; k < 6; k++)
            *numbers_of(i)[k] = known[i][k] * (k > 0 && k < 4 ? turned : uniform(1 - off, 1 + off, seed));
    }
}

/* ---- 2 a goal ---- */

static const roln_real most[N] = {60, 120, 60, 15, 15, 8}; /* Nm */
static roln_real low[N], high[N];                         /* rad, of the joints */
static roln_real slope[N], wall;                          /* m/rad, of the tip's x at the measured pose; its limit, as one of C q */
enum { OF_JOINTS, OF_TIP, BOTH };
static roln_real tighten[BOTH][AHEAD * N], reserve[AHEAD * N];
static roln_real P[4 * N * N], end[2 * N];
/* As bad as each other: 0.1 rad, 1 rad/s, 3 mrad or 3 mm beyond a limit, two limits of torque. */
static const roln_real near[N] = {100, 100, 100, 100, 100, 100}, slow[N] = {1, 1, 1, 1, 1, 1};
static const roln_real stop[N] = {100000, 100000, 100000, 100000, 100000, 100000}, still[N];
static const roln_term limit[BOTH] = {{.of = ROLN_OF_Q, .weight = stop, .low = low, .high = high},
                                      {.of = ROLN_OF_Q, .count = 1, .C = slope, .weight = stop, .high = &wall}};
static roln_real cheap[N], hold[N], q_ref[N];
static const roln_limits limits = {.dt = (roln_real)TICK, .margin = 2, .tau_each = most};
static roln_term terms[3] = {{.of = ROLN_OF_Q, .weight = near, .ref = q_ref},
                             {.of = ROLN_OF_QD, .weight = slow, .ref = still}};
static roln_goal goal = {.dt = (roln_real)STEP, .term = terms, .u = cheap, .hold = hold, .limits = &limits, .P = P, .end = end};
static arm_work work;
static arm_plan_next_work planwork;
static arm_plan_tighten_work tightwork;

static void prepare(void)
{
    static arm_lqr_work lqrwork;
    const roln_cost cost = {.q = near, .qd = slow, .u = cheap, .dt = (roln_real)STEP};
    arm_latent at = {{0}, {0}};
    roln_real K[2 * N * N];
    for (int i = 0; i < N; i++) {
        for (int k = 0; k < 6; k++)
            known[i][k] = *numbers_of(i)[k];
        low[i] = (roln_real)(middle[i] - 0.6 * reach[i]), high[i] = (roln_real)(middle[i] + 0.6 * reach[i]);
        cheap[i] = ROLN_C(0.25) / (most[i] * most[i]), at.z[i] = (roln_real)middle[i] / arm_weights.scale.q;
    }
    if (arm_lqr(&arm_weights, &cost, &at, NULL, K, P, &lqrwork) != ROLN_OK) exit(1);
}

static arm_latent latent_of(const motion *s)
{
    arm_latent z;
    for (int i = 0; i < N; i++)
        z.z[i] = (roln_real)s->q[i] / arm_weights.scale.q, z.zd[i] = (roln_real)s->qd[i] / arm_weights.scale.q;
    return z;
}

/* The tip's x: the middle of the last link. */
static double tip_of(const double angle[N])
{
    const pose p = pose_of(angle);
    return p.at[N - 1][0] + p.arm[N - 1][0];
}

/* The wall for plans from a pose: the slope of the tip's x there, and the limit of C q. */
static void see_wall(const double angle[N])
{
    const pose p = pose_of(angle);
    double sum = 0;
    for (int i = 0; i < N; i++) {
        double lever[3], v[3];
        for (int k = 0; k < 3; k++)
            lever[k] = p.at[N - 1][k] + p.arm[N - 1][k] - p.at[i][k];
        cross(p.axis[i], lever, v);
        slope[i] = (roln_real)v[0], sum += v[0] * angle[i];
    }
    wall = (roln_real)(WALL - tip_of(angle) + sum);
}

/* At rest within the limits and 20 mm or more from the wall, and a goal whose joints are beyond a limit one time in four, up to
   0.2 rad. */
static motion draw(uint64_t *seed)
{
    motion s = {{0}, {0}};
    arm_latent at;
    do {
        for (int i = 0; i < N; i++)
            s.q[i] = middle[i] + uniform(-0.6, 0.6, seed) * ((double)high[i] - (double)low[i]) / 2;
    } while (tip_of(s.q) > WALL - 0.02);
    for (int i = 0; i < N; i++) {
        const double side = uniform(-1, 1, seed) < 0 ? -1 : 1, part = uniform(0, 1, seed);
        const double half = ((double)high[i] - (double)low[i]) / 2, beyond = uniform(0, 0.2, seed);
        q_ref[i] = (roln_real)(middle[i] + side * (part < 0.25 ? half + beyond : part * half));
    }
    for (int i = 0; i < N; i++)
        at.z[i] = end[i] = q_ref[i] / arm_weights.scale.q, at.zd[i] = end[N + i] = 0;
    if (arm_inverse(&arm_weights, &at, NULL, at.zd, hold, &work.inverse) != ROLN_OK) exit(1);
    for (int i = 0; i < N; i++)
        hold[i] = hold[i] / arm_weights.scale.q;
    return s;
}

/* ---- 3 what the model does not know ---- */

enum { FLEET = 30, SAMPLES = 300, WINDOW = 60 }; /* machines that were recorded, samples of each; of a window for errors ahead */
#define SAMPLE 0.01 /* s */
static roln_real q[FLEET * SAMPLES * N], qd[FLEET * SAMPLES * N], tau[FLEET * SAMPLES * N];
static arm_evidence evidence;
static arm_train train;

/* Other machines, led by soft PD along sines about the middle. */
static void record(uint64_t *seed)
{
    for (int m = 0; m < FLEET; m++) {
        double size[N], rate[N], phase[N], torque[N];
        motion s = {{0}, {0}};
        another(OFF, seed);
        memcpy(s.q, middle, sizeof s.q);
        for (int i = 0; i < N; i++)
            size[i] = uniform(0.3, 0.8, seed) * reach[i], rate[i] = uniform(2, 6, seed), phase[i] = uniform(0, 6.28, seed);
        for (int k = 0; k < SAMPLES; k++) {
            const int at = (m * SAMPLES + k) * N;
            for (int i = 0; i < N; i++) {
                const double to = middle[i] + size[i] * sin(rate[i] * k * SAMPLE + phase[i]);
                torque[i] = (double)most[i] * fmax(-1, fmin(1, 2 * (to - s.q[i]) - 0.2 * s.qd[i]));
                q[at + i] = (roln_real)s.q[i], qd[at + i] = (roln_real)s.qd[i], tau[at + i] = (roln_real)torque[i];
            }
            for (int i = 0; i < 2; i++)
                advance(&s, torque, SAMPLE / 2);
        }
    }
}

static void know(uint64_t *seed)
{
    static int start[FLEET * SAMPLES];
    roln_batch b = {.steps = 1, .stride = 1, .start = start, .q = q, .qd = qd, .tau = tau};
    const int spans[3] = {SAMPLES - 1, 5, WINDOW};
    record(seed);
    for (int what = 0; what < 3; what++) {
        roln_status st;
        b.steps = spans[what], b.count = 0;
        for (int k = 0; k < FLEET; k++)
            for (int at = 0; at + b.steps < SAMPLES; at += what == 2 ? 2 * WINDOW : b.steps)
                start[b.count++] = k * SAMPLES + at;
        st = what == 0   ? arm_evidence_add(&arm_weights, &b, &evidence, &train.evidence_add)
             : what == 1 ? arm_fit_doubt(&arm_weights, &b, (roln_real)SAMPLE, &evidence, &train.fit_doubt)
                         : arm_fit_outlook(&arm_weights, &b, (roln_real)SAMPLE, &evidence, &train.fit_outlook);
        if (st != ROLN_OK) exit(1);
    }
}

/* The largest numbers of plans on the way to some goals, without limits of the joints, on the model. */
static void tighten_for(int goals, roln_real sigmas, uint64_t *seed)
{
    static arm_plan plan;
    goal.terms = 2, goal.reserve = NULL;
    memset(tighten, 0, sizeof tighten), memset(reserve, 0, sizeof reserve);
    for (int k = 0; k < goals; k++) {
        const motion from = draw(seed);
        arm_latent s = latent_of(&from);
        memset(&plan, 0, sizeof plan);
        for (int t = 0; t < 20; t++) {
            roln_real one[AHEAD * N];
            double angle[N];
            for (int i = 0; i < N; i++)
                angle[i] = (double)(s.z[i] * arm_weights.scale.q);
            see_wall(angle);
            if (arm_plan_next(&arm_weights, &goal, &s, &plan, &planwork) != ROLN_OK) break;
            for (int what = 0; what <= BOTH && t % 4 == 3; what++) {
                const roln_term *const of = what < BOTH ? limit + what : NULL;
                roln_real *const all = of ? tighten[what] : reserve;
                if (arm_plan_tighten(&arm_weights, &evidence, &goal, &plan, of, sigmas, one, &tightwork) != ROLN_OK) exit(1);
                for (int i = 0; i < AHEAD * (what == OF_TIP ? 1 : N); i++)
                    all[i] = ROLN_MAX(all[i], of ? one[i] : ROLN_MIN(one[i], most[i % N] / 2));
            }
            s = plan.s[1];
        }
    }
}

/* ---- 4 closed loops ---- */

enum { NO_LIMITS, LIMITS, TIGHTENED, WAYS, TICKS = 300, EVERY = 10 }; /* ticks from plan to plan */
typedef struct { int runs, beyond, refused; double deepest, off, time, plan; } result;

/* How far the farthest joint is from the goal, or from the limit that is next to a goal beyond it; *out: beyond its limits. */
static double distance(int what, const motion *s, double *out)
{
    double far = 0;
    if (what == OF_TIP) *out = fmax(*out, tip_of(s->q) - WALL);
    for (int i = 0; i < N; i++) {
        const double to = fmax((double)low[i], fmin((double)high[i], (double)q_ref[i]));
        if (what == OF_JOINTS) *out = fmax(*out, fmax((double)low[i] - s->q[i], s->q[i] - (double)high[i]));
        far = fmax(far, fabs(s->q[i] - to));
    }
    return far;
}

/* 1.2 s from a random state to a random goal on a random machine. */
static void move(int what, int way, uint64_t seed, result *r)
{
    static arm_plan plan;
    motion s = draw(&seed);
    double out = 0, off = 0, arrived = 0;
    another(OFF, &seed);
    memset(&plan, 0, sizeof plan);
    goal.terms = way == NO_LIMITS ? 2 : 3;
    terms[2] = limit[what];
    terms[2].tighten = way == TIGHTENED ? tighten[what] : NULL, goal.reserve = way == TIGHTENED ? reserve : NULL;
    for (int t = 0; t < TICKS; t++) {
        const arm_latent z = latent_of(&s);
        roln_real u[N] = {0};
        double torque[N];
        if (t % EVERY == 0) {
            const clock_t start = clock();
            see_wall(s.q);
            r->refused += arm_plan_next(&arm_weights, &goal, &z, &plan, &planwork) != ROLN_OK;
            r->plan += (double)(clock() - start) / CLOCKS_PER_SEC / (TICKS / EVERY);
        }
        if (arm_plan_follow(&arm_weights, &goal, &plan, (roln_real)(TICK * (t % EVERY)), &z, u) != ROLN_OK) r->refused++;
        for (int i = 0; i < N; i++)
            torque[i] = (double)u[i];
        advance(&s, torque, TICK);
        off = distance(what, &s, &out);
        if (off > 0.1) arrived = (t + 1) * TICK;
    }
    r->runs++, r->beyond += out > 0, r->deepest = fmax(r->deepest, out), r->off += off, r->time += arrived;
}

/* All motions, a line for each kind of plans, and what they must show. Without tightening one in `often` leaves the limits, or
   more. */
static void moves(int what, int count, int often)
{
    static const char *const name[WAYS] = {"no limits", "limits", "limits, tightened"};
    result r[WAYS] = {{0, 0, 0, 0, 0, 0, 0}};
    double least = 9, largest = 0;
    for (int i = 0; i < AHEAD * (what == OF_TIP ? 1 : N); i++)
        least = fmin(least, (double)tighten[what][i]), largest = fmax(largest, (double)tighten[what][i]);
    printf("\n%s: limits tightened by %.0f to %.0f %s\n", what == OF_TIP ? "tip" : "joints", 1e3 * least, 1e3 * largest,
           what == OF_TIP ? "mm" : "mrad");
    printf("| plans with | motions that leave the limits | deepest, %s | time to 0.1 rad of the goal, s "
           "| distance at the end, mrad | a plan, ms |\n|---|---|---|---|---|---|\n", what == OF_TIP ? "mm" : "mrad");
    for (int way = 0; way < WAYS; way++) {
        for (int k = 0; k < count; k++)
            move(what, way, 1000 + (uint64_t)k, r + way);
        printf("| %s | %d of %d | %.1f | %.3f | %.0f | %.2f |\n", name[way], r[way].beyond, count, 1e3 * r[way].deepest,
               r[way].time / count, 1e3 * r[way].off / count, 1e3 * r[way].plan / count);
        CHECK(r[way].refused == 0);
    }
    CHECK(r[LIMITS].beyond > count / often);
    CHECK(r[TIGHTENED].beyond == 0);
    CHECK_BELOW(r[TIGHTENED].time, 1.25 * r[LIMITS].time);
}

int main(int argc, char **argv)
{
    const int count = argc > 1 && strcmp(argv[1], "test") == 0 ? 100 : 1000;
    uint64_t seed = 1;
    prepare();
    know(&seed);
    tighten_for(10, 3, &seed);
    printf("errors last %.2f s\n", (double)evidence.lasts);
    moves(OF_JOINTS, count, 2), moves(OF_TIP, count, 8);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
