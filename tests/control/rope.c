/* SPDX-License-Identifier: MIT */
/* rope - MuJoCo's rope of ten links below a trolley; two motors, a force on the trolley and a torque on the first link, move its
   tip by the rope's length and bring it to rest: by plans on a model learned from recordings, by PD, and in the shortest time that
   the true plant allows.
     rope [OUT.svg]      compares the three, and draws them: `make rope`, a few minutes
     rope check          plans and PD alone, against the goals that were reached. Last line: N passed, N failed
     rope record         recordings; from them the weights: make build/rope_weights.h, ten minutes on one core

   1 recordings     2 plans on the model     3 PD     4 picture     5 comparison */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../unit/check.h"
#include "rope.h"
#include "rope_plant.h"
#include "rope_weights.h"

static mjModel *plant;
static mjData *d;
static struct plant_run run;

enum { PLANS, PD, BEST, LAWS };
static struct plant_run runs[LAWS];
static double settled[LAWS];

/* ---- 1 recordings ----------------------------------------------------------------------------- */

enum { RECORDINGS = 90, SAMPLES = 900, APART = 2 }; /* samples of a recording, ticks of a sample */

static double between(double low, double high, uint64_t *seed)
{
    return low + (high - low) * (double)roln_uniform(seed);
}

/* Steps that hold for .05 to 1.2 s: of what PD of other gains each time is to reach, or, in one recording of three, of what the
   motors give; they give it a little later, by a lag of 25 ms, so that the links that the model leaves out hardly ring. One
   recording of six swings freely from .6 s on. */
static void record(void)
{
    uint64_t seed = 1;
    for (int k = 0; k < RECORDINGS; k++) {
        const int kind = k % 3, fall = k % 6 == 5 ? 300 : SAMPLES;
        double to[2] = {0, 0}, gain[4] = {0, 0, 0, 0}, u[2] = {0, 0}, left = 0;
        mj_resetData(plant, d);
        d->qpos[0] = between(-0.1, 1.1, &seed);
        for (int i = 0; i < SAMPLES; i++) {
            const double t = i * APART * ROPE_TICK;
            if ((left -= APART * ROPE_TICK) <= 0) {
                const double pd = kind < 2;
                left = between(0.05, kind ? 0.4 : 1.2, &seed);
                to[0] = between(-0.1, 1.1, &seed), to[1] = between(-0.2, 0.2, &seed);
                gain[0] = pd ? between(4, 40, &seed) : 0, gain[1] = pd ? between(1, 8, &seed) : 0;
                gain[2] = pd ? between(0, 3, &seed) : 0, gain[3] = pd ? between(0, 0.4, &seed) : 0;
                if (!pd) gain[0] = 3, gain[1] = 0.5, to[0] = between(-2, 3, &seed);
            }
            for (int j = 0; j < 2; j++) {
                const double most = plant->actuator_ctrlrange[2 * j + 1];
                double want = gain[2 * j] * (to[j] - d->qpos[j]) - gain[2 * j + 1] * d->qvel[j] + (j && kind == 2 ? to[1] : 0);
                want = i < fall ? fmin(most, fmax(-most, want)) : 0;
                u[j] += APART * ROPE_TICK / 0.025 * (want - u[j]);
            }
            printf("%.4g", t);
            for (int j = 0; j < rope_N; j++)
                printf(" %.8g", d->qpos[j]);
            for (int j = 0; j < rope_N; j++)
                printf(" %.8g", d->qvel[j]);
            for (int j = 0; j < rope_N; j++)
                printf(" %.7g", j < 2 ? u[j] : 0);
            printf("\n");
            for (int j = 0; j < 2; j++)
                d->ctrl[j] = u[j];
            for (int j = 0; j < APART; j++)
                mj_step(plant, d);
        }
        printf("\n");
    }
}

/* ---- 2 plans on the model --------------------------------------------------------------------- */

/* As bad as each other: .045 m of the tip, .3 m or rad of any joint, 1 m/s or rad/s; 25 N, .6 Nm, three
   times the limits of the motors. The tip is an output C q: its place along the rail to first order, links of 0.1 m. */
#define LINK ROLN_C(-0.1)
static const roln_real tip_at[rope_N] = {1, 10 * LINK, 9 * LINK, 8 * LINK, 7 * LINK, 6 * LINK,
                                         5 * LINK, 4 * LINK, 3 * LINK, 2 * LINK, LINK};
static const roln_real target[rope_N] = {(roln_real)ROPE_TARGET}; /* [0]: of trolley and tip; all else hangs straight */
static const roln_real still[rope_N] = {0};
static const roln_real tip_weight[1] = {500}, q_weight[rope_N] = {10, 10, 10, 10, 10, 10, 10, 10, 10, 10, 10};
static const roln_real qd_weight[rope_N] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1}, u_weight[2] = {ROLN_C(0.0016), ROLN_C(2.5)};
static const roln_term terms[3] = {
    {.of = ROLN_OF_Q, .count = 1, .C = tip_at, .weight = tip_weight, .ref = target},
    {.of = ROLN_OF_Q, .weight = q_weight, .ref = target},
    {.of = ROLN_OF_QD, .weight = qd_weight, .ref = still},
};
static const roln_real B[2 * rope_N] = {1, 0, 0, 1}, most[2] = {8, ROLN_C(0.2)};
static const roln_motors motors = {2, B, 0};
static const roln_limits limits = {.dt = (roln_real)ROPE_TICK, .margin = 1, .hold = 5, .tau_each = most, .motors = &motors};
enum { EVERY = 20, MOVE_TICKS = 5000 }; /* ticks from plan to plan, of a move */
static const roln_goal goal = {.dt = EVERY * (roln_real)ROPE_TICK, .terms = 3, .term = terms, .u = u_weight, .limits = &limits};

static struct {
    rope_guard guard; /* guard.tau: force and torque of the motors */
    rope_plan plan;
    int age; /* ticks since the last call of rope_plan_next */
    rope_work work;
    rope_plan_next_work planwork;
    double seconds;
    int plans, refused;
} p;

/* One tick, 1 kHz. */
static void planner_tick(const double *q, const double *qd)
{
    rope_state x;
    rope_latent s;
    roln_real u[2];
    int known, good;
    for (int i = 0; i < rope_N; i++)
        x.q[i] = (roln_real)q[i], x.qd[i] = (roln_real)qd[i];
    known = rope_encode(&rope_weights, &x, &s, &p.work.encode) == ROLN_OK;
    if (known && p.age % EVERY == 0) {
        const clock_t start = clock();
        p.refused += rope_plan_next(&rope_weights, &goal, &s, &p.plan, &p.planwork) != ROLN_OK;
        p.seconds += (double)(clock() - start) / CLOCKS_PER_SEC, p.plans++, p.age = 0;
    }
    good = known && rope_plan_follow(&rope_weights, &goal, &p.plan, (roln_real)p.age * (roln_real)ROPE_TICK, &s, u) == ROLN_OK;
    rope_guard_tick(&rope_weights, &limits, &x, known ? &s : NULL, good ? u : NULL, &p.guard, &p.work.guard_tick);
    p.age++;
}

static double by_plans(int ticks)
{
    memset(&p, 0, sizeof p);
    plant_start(plant, d, &run);
    while (run.ticks < ticks) {
        planner_tick(d->qpos, d->qvel);
        const double u[2] = {(double)p.guard.tau[0], (double)p.guard.tau[1]};
        plant_tick(plant, d, u, &run);
    }
    return plant_settled(&run);
}

/* ---- 3 PD ------------------------------------------------------------------------------------- */

/* On trolley and first joint, of the target as it is. */
static double by_pd(const double gain[4], int ticks)
{
    plant_start(plant, d, &run);
    while (run.ticks < ticks) {
        const double u[2] = {gain[0] * (ROPE_TARGET - d->qpos[0]) - gain[1] * d->qvel[0],
                             -gain[2] * d->qpos[1] - gain[3] * d->qvel[1]};
        plant_tick(plant, d, u, &run);
    }
    return plant_settled(&run);
}

/* The best of a grid about the gains, each times factor^k, k = -wide .. wide. */
static void grid(double gain[4], double factor, int wide)
{
    const double middle[4] = {gain[0], gain[1], gain[2], gain[3]};
    const int side = 2 * wide + 1;
    double least = 1e9;
    for (int k = 0; k < side * side * side * side; k++) {
        double g[4];
        for (int i = 0, at = k; i < 4; i++, at /= side)
            g[i] = middle[i] * pow(factor, at % side - wide);
        const double t = by_pd(g, MOVE_TICKS);
        if (t < least) least = t, memcpy(gain, g, sizeof g);
    }
    printf("  %d gains by factors of %g: %.2f s with %.3g N/m, %.3g Ns/m, %.3g Nm/rad, %.3g Nms/rad\n", side * side * side * side,
           factor, least, gain[0], gain[1], gain[2], gain[3]);
}

/* ---- 4 picture -------------------------------------------------------------------------------- */

enum { SHOWN = 4000 }; /* ticks, from 60 to 876 of the width */
typedef struct { double top, height, low, high, tick; } axes;
static const char *const colour[LAWS] = {"#08519c", "#e6550d", "#31a354"}, *const name[LAWS] = {"plans", "PD", "time-optimal"};

static void draw_axes(FILE *f, const axes *a, const char *title)
{
    fprintf(f, "<text x='60' y='%g' font-weight='bold'>%s</text>\n", a->top - 10, title);
    for (double y = a->low; y <= a->high + 1e-9; y += a->tick)
        fprintf(f, "<text x='54' y='%.1f' text-anchor='end'>%g</text>\n",
                a->top + a->height * (a->high - y) / (a->high - a->low) + 4, fabs(y) < 1e-9 ? 0 : y);
    for (int i = 0; i <= SHOWN; i += 500)
        fprintf(f, "<text x='%d' y='%g' text-anchor='middle'>%g%s</text>\n", 60 + 816 * i / SHOWN, a->top + a->height + 18,
                i * ROPE_TICK, i == SHOWN ? " s" : "");
    fprintf(f, "<path d='M60 %gv%gh816' fill='none' stroke='#444'/>\n", a->top, a->height);
}

/* x or z of the tip, or the force on the trolley, of each law, as long as it runs. */
static void draw_courses(FILE *f, const axes *a, int what)
{
    for (int law = LAWS - 1; law >= 0; law--) {
        fprintf(f, "<path fill='none' stroke='%s' stroke-width='1.6' d='", colour[law]);
        for (int k = 0; k < SHOWN && k < runs[law].ticks; k += 10) {
            const double y = what == 2 ? runs[law].u[k][0] : runs[law].tip[k][what] + (what ? 0 : ROPE_MOVE);
            fprintf(f, "%c%.1f %.1f", k ? 'L' : 'M', 60 + 816.0 * k / SHOWN,
                    a->top + a->height * (a->high - fmax(a->low, fmin(a->high, y))) / (a->high - a->low));
        }
        fprintf(f, "'/>\n");
    }
}

static int draw(const char *path)
{
    const axes x = {64, 200, -0.5, 1.5, 0.5}, z = {320, 90, 0, 0.4, 0.2}, u = {466, 110, -8, 8, 4};
    FILE *f = fopen(path, "w");
    if (!f) return perror(path), 1;
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='612' viewBox='0 0 900 612' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='900' height='612' fill='#fff'/>\n<text x='24' y='28' "
               "font-size='16'>The tip of a rope is moved by its length</text>\n");
    for (int law = 0; law < LAWS; law++)
        fprintf(f, "<path d='M%d 24h20' stroke='%s' stroke-width='2'/><text x='%d' y='28'>%s, %.2f s</text>\n", 420 + 150 * law,
                colour[law], 446 + 150 * law, name[law], settled[law]);
    fprintf(f, "<rect x='60' y='%.1f' width='816' height='%.1f' fill='#eee'/>\n",
            x.top + x.height * (x.high - 1 - ROPE_NEAR) / (x.high - x.low), 2 * ROPE_NEAR * x.height / (x.high - x.low));
    draw_axes(f, &x, "tip along the rail, m, and what counts as at its target"), draw_courses(f, &x, 0);
    draw_axes(f, &z, "tip above the target, m"), draw_courses(f, &z, 1);
    draw_axes(f, &u, "force on the trolley, N"), draw_courses(f, &u, 2);
    fprintf(f, "</svg>\n");
    return fclose(f) != 0;
}

/* ---- 5 comparison ----------------------------------------------------------------------------- */

static void row(int law)
{
    runs[law] = run, settled[law] = plant_settled(&run);
    printf("%-13s %5.2f s; farthest off then %4.2f %% of the move, half a second later %4.2f %%; a motor at its limit: %.0f %%\n",
           name[law], settled[law], 100 / ROPE_MOVE * plant_swing(&run, settled[law]),
           100 / ROPE_MOVE * plant_swing(&run, settled[law] + 0.5), 100 * plant_at_limit(plant, &run, settled[law]));
}

static int compare(const char *picture)
{
    double gain[4] = {4, 3, 0.1, 0.2};
    printf("PD, the time until the tip is within %g %% of its target for good and slower than %g %% of the move a second\n",
           100 * ROPE_NEAR, 100 * ROPE_SLOW);
    grid(gain, 2, 2), grid(gain, 1.3, 2), grid(gain, 1.1, 2);
    printf("time-optimal on the true plant, force and torque held for %g ms each\n", 1e3 * ROPE_EVERY * ROPE_TICK);
    if (plant_best(plant, &run, 1) == 0) return printf("no time-optimal solution\n"), 1;
    printf("\n");
    runs[BEST] = run;
    by_plans(MOVE_TICKS), row(PLANS);
    printf("a plan takes %.1f ms here, %d of %d were refused; RAM: plan %u bytes, its scratch %u bytes\n",
           1e3 * p.seconds / p.plans, p.refused, p.plans, (unsigned)sizeof p.plan, (unsigned)sizeof p.planwork);
    by_pd(gain, MOVE_TICKS), row(PD);
    run = runs[BEST], row(BEST);
    printf("plans take %.2f of the time of PD, %.2f of that of the time-optimal solution\n", settled[PLANS] / settled[PD],
           settled[PLANS] / settled[BEST]);

    return picture ? draw(picture) : 0;
}

/* The goals: rest in half of the time of PD with the gains of the grid, and in 1.3 of that of the time-optimal solution. */
#define SHORTEST 1.14 /* s, of that solution, as `make rope` finds it */
static int check(void)
{
    static const double gain[4] = {2.60355, 2.53846, 0.0122256, 0.107585};
    const double pd = by_pd(gain, MOVE_TICKS), plans = by_plans(MOVE_TICKS);
    CHECK(p.refused == 0 && p.guard.g.faults == 0);
    CHECK_BELOW(pd, 3.85);
    CHECK_BELOW(plans, pd / 2);
    CHECK_BELOW(plans, 1.3 * SHORTEST);
    CHECK_BELOW(plant_swing(&run, 1.3 * SHORTEST), ROPE_NEAR * ROPE_MOVE);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}

int main(int argc, char **argv)
{
    int bad = 0;
    plant = plant_load();
    if (!plant) return 1;
    d = mj_makeData(plant);
    if (argc > 1 && strcmp(argv[1], "record") == 0) record();
    else if (argc > 1 && strcmp(argv[1], "check") == 0) bad = check();
    else bad = compare(argc > 1 ? argv[1] : NULL);
    mj_deleteData(d), mj_deleteModel(plant);
    return bad;
}
