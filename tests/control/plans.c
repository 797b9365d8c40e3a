/* SPDX-License-Identifier: MIT */
/* plans - NAME_plan on the chain of 16 pendulums with four motors whose torque is limited (swift.h): along fast references in
   MuJoCo, against PD+ that is clipped; limits of many plans, against plans that know none and are clipped; and against the best
   that is found offline (offline.h).
     plans           from the top of the repository: everything, four minutes
     plans test      a part of it */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/pend16.h"
#include "swift.h"
#include "../mujoco/truth.h"
#include "../unit/check.h"
#include "control.h"
#include "offline.h"

enum { N = SWIFT_N, n = 4, MOTORS = SWIFT_MOTORS, STEPS = SWIFT_STEPS, EVERY = 20, /* ms from plan to plan */
       CHANGE = 10 /* plans from goal to goal */ };
static const roln_real B[N * MOTORS] = SWIFT_B;
static const roln_motors motors = {MOTORS, B, ROLN_C(1e-3)};

/* ---- 1 the model, a goal, a loop ---- */

static swift_params params;
static swift_work work;
static swift_plan_next_work planwork;
static swift_lqr_work lqrwork;

static int load(const char *path)
{
    static unsigned char bytes[pend16_packed_size + 1];
    static pend16_params p;
    FILE *f = fopen(path, "rb");
    const int count = f ? (int)fread(bytes, 1, sizeof bytes, f) : 0;
    if (f) fclose(f);
    if (sizeof p != sizeof params || pend16_unpack(count, bytes, &p) != ROLN_OK) return -1;
    memcpy(&params, &p, sizeof p); /* but for the integrator the same config */
    return offline_load(swift_numbers, (const float *)&params);
}

/* A goal and what it points to: joints q, qd of every step, or those of the first for all. */
typedef struct {
    roln_real q[STEPS * N], qd[STEPS * N], weight[N], slow[N], dear[MOTORS], P[4 * n * n], end[2 * n];
    roln_term terms[2];
    roln_limits limits;
    roln_goal goal;
} wish;

static void wish_start(wish *w, double limit, int moving)
{
    memset(w, 0, sizeof *w);
    for (int i = 0; i < N; i++)
        w->weight[i] = SWIFT_Q, w->slow[i] = (roln_real)SWIFT_QD;
    for (int j = 0; j < MOTORS; j++)
        w->dear[j] = (roln_real)SWIFT_U(limit);
    w->terms[0] = (roln_term){.of = ROLN_OF_Q, .weight = w->weight, .ref = w->q, .moving = moving};
    w->terms[1] = (roln_term){.of = ROLN_OF_QD, .weight = w->slow, .ref = w->qd, .moving = moving};
    w->limits = (roln_limits){.dt = ROLN_C(0.001), .margin = ROLN_C(0.5), .tau = (roln_real)limit, .motors = &motors};
    w->goal = (roln_goal){.dt = (roln_real)SWIFT_DT, .terms = 2, .term = w->terms, .u = w->dear, .limits = &w->limits};
}

static void to_joints(const roln_real *u, roln_real tau[N])
{
    memset(tau, 0, N * sizeof *tau);
    for (int j = 0; j < MOTORS; j++)
        tau[SWIFT_JOINT * j] = u[j];
}

/* Of plans: how many, with a torque at a limit, torques beyond one, refused. */
static struct { int plans, full, beyond, refused; } seen;

static roln_status look(roln_status st, const swift_plan *p, double limit)
{
    int at_limit = 0;
    for (int i = 0; i < STEPS * MOTORS; i++) {
        const double part = fabs((double)p->u[i]) / limit;
        seen.beyond += !(part <= 1), at_limit |= part > 0.99;
    }
    seen.plans++, seen.full += at_limit, seen.refused += st != ROLN_OK;
    return st;
}

static double uniform(uint64_t *seed, double low, double high)
{
    return low + (high - low) * (double)roln_uniform(seed);
}

/* ---- 2 fast references in MuJoCo ---- */

/* A controller, called 1,000 times a second; what it wants may be beyond the limit. */
typedef struct {
    double limit;
    const struct control_reference *r;
    struct control_gains gains; /* of PD+; of plans not read */
    wish w;
    swift_plan plan, next;      /* followed; made for the state a step ahead, as on a machine, where it takes that long */
} controller;

static void reference(const controller *c, double t, roln_real q[3 * N])
{
    double x[3][N];
    control_reference_at(c->r, 2 + t, x[0], x[1], x[2]); /* without its slow start */
    for (int i = 0; i < 3 * N; i++)
        q[i] = (roln_real)x[i / N][i % N];
}

static void pd(controller *c, int tick, const swift_latent *s, roln_real u[MOTORS])
{
    roln_real x[3 * N], tau_z[n];
    swift_target to;
    memset(&to, 0, sizeof to);
    reference(c, tick * 1e-3, x);
    if (swift_encode_reference(&params, x, x + N, x + 2 * N, &to, &work.encode_reference) != ROLN_OK) return;
    memcpy(to.kp, c->gains.kp, sizeof to.kp), memcpy(to.kd, c->gains.kd, sizeof to.kd);
    if (swift_control(&params, s, &to, tau_z, &work.control) == ROLN_OK)
        (void)swift_allocate(&params, s, &motors, tau_z, u, NULL, &work.allocate);
}

static void planned(controller *c, int tick, const swift_latent *s, roln_real u[MOTORS])
{
    if (tick % EVERY == 0) {
        swift_latent ahead = *s;
        roln_real tau[N], x[3 * N];
        c->plan = c->next;
        to_joints(c->plan.u + MOTORS * c->plan.plan.age, tau);
        if (swift_step(&params, &ahead, tau, (roln_real)SWIFT_DT, &work.step) != ROLN_OK) return;
        for (int k = 0; k < STEPS; k++) {
            reference(c, tick * 1e-3 + (k + 2) * SWIFT_DT, x);
            memcpy(c->w.q + k * N, x, N * sizeof *x), memcpy(c->w.qd + k * N, x + N, N * sizeof *x);
        }
        (void)look(swift_plan_next(&params, &c->w.goal, &ahead, &c->next, &planwork), &c->next, c->limit);
    }
    if (swift_plan_follow(&params, &c->w.goal, &c->plan, (roln_real)(tick % EVERY * 1e-3), s, u) != ROLN_OK)
        memset(u, 0, MOTORS * sizeof *u);
}

/* Rms error of the joints, rad, over `ticks` ms; *full: the part of the ticks in which a motor gives all. */
static double track(controller *c, void (*law)(controller *, int, const swift_latent *, roln_real *), int ticks, double *full)
{
    struct truth_plant *plant;
    double q[N], qd[N], tau[N] = {0}, sum = 0;
    roln_real x[3 * N], u[MOTORS] = {0};
    int at_limit = 0;
    reference(c, 0, x);
    for (int i = 0; i < N; i++)
        q[i] = (double)x[i], qd[i] = (double)x[N + i];
    if (truth_plant_open(&plant, q, qd)) exit(1);
    for (int k = 0; k < ticks; k++) {
        swift_state m;
        swift_latent s;
        int now = 0;
        truth_plant_state(plant, q, qd);
        reference(c, k * 1e-3, x);
        for (int i = 0; i < N; i++) {
            sum += pow(q[i] - (double)x[i], 2);
            m.q[i] = (roln_real)q[i], m.qd[i] = (roln_real)qd[i];
        }
        if (swift_encode(&params, &m, &s, &work.encode) == ROLN_OK) law(c, k, &s, u);
        for (int j = 0; j < MOTORS; j++) {
            tau[SWIFT_JOINT * j] = fmax(-c->limit, fmin(c->limit, (double)u[j]));
            now |= fabs(tau[SWIFT_JOINT * j]) > 0.99 * c->limit;
        }
        at_limit += now;
        if (truth_plant_step(plant, tau)) exit(1);
    }
    truth_plant_close(plant);
    *full = (double)at_limit / ticks;
    return sqrt(sum / ticks / N);
}

static void references(int count, int seconds)
{
    static const double limits[] = {1000, 20, 15}, gains[] = {3, 5, 7, 10};
    static controller c;
    struct control_model *m = control_load(CONTROL_MODEL);
    if (!m) exit(1);
    printf("along %d references, %d s each, in MuJoCo; rms error of 16 joints, mrad (ticks at the limit)\n"
           "limit, Nm    PD+ of 3            5            7           10 rad/s plans\n", count, seconds);
    for (int l = 0; l < 3; l++) {
        double best = INFINITY, mean = 0, full = 0, part;
        printf("%9g", limits[l]);
        for (int g = 0; g <= 4; g++) {
            mean = full = 0;
            for (int k = 0; k < count; k++) {
                const struct control_reference r = control_reference((uint64_t)k + 1);
                memset(&c, 0, sizeof c);
                c.limit = limits[l], c.r = &r;
                wish_start(&c.w, c.limit, 1);
                if (g < 4 && control_gains(m, gains[g], 1, &c.gains)) exit(1);
                mean += pow(track(&c, g < 4 ? pd : planned, 1000 * seconds, &part), 2) / count;
                full += part / count;
            }
            mean = sqrt(mean);
            if (g < 4) best = fmin(best, mean);
            printf(" %8.4g (%2.0f)", 1e3 * mean, 100 * full);
        }
        printf("   %.3g of the best\n", mean / best);
        if (l > 0) CHECK_BELOW(mean, best / 2); /* where motors are strong enough, PD+ is better */
    }
    control_free(m);
}

/* ---- 3 many plans ---- */

/* A pose within what training has seen, as joints, too. */
static swift_latent draw(uint64_t *seed, roln_real q[N])
{
    swift_latent s = {{0}, {0}};
    swift_state x;
    for (int i = 0; i < n; i++)
        s.z[i] = params.z_min[i] + (params.z_max[i] - params.z_min[i]) * (roln_real)uniform(seed, .25, .75);
    if (swift_decode(&params, &s, &x, &work.decode) != ROLN_OK) exit(1);
    if (q) memcpy(q, x.q, sizeof x.q);
    return s;
}

/* From rest at s, `steps` steps on the model by plans with the limit that they are told, clipped to w's: the cost of what was done
   as w has it, of states behind each step. seed: every CHANGE steps another pose is the goal; 0: w's. u [steps][MOTORS] out, NULL:
   not wanted. */
static double run(wish *w, double told, swift_latent s, int steps, uint64_t seed, float *u)
{
    const double limit = (double)w->limits.tau;
    static swift_plan p;
    roln_limits limits = w->limits;
    roln_goal goal = w->goal;
    double cost = 0;
    limits.tau = (roln_real)told, goal.limits = &limits;
    memset(&p, 0, sizeof p);
    for (int k = 0; k < steps; k++) {
        swift_state x;
        roln_real now[MOTORS] = {0}, tau[N];
        roln_status st;
        if (seed && k % CHANGE == 0) (void)draw(&seed, w->q);
        st = swift_plan_next(&params, &goal, &s, &p, &planwork);
        if (told <= limit) (void)look(st, &p, limit);
        if (swift_plan_follow(&params, &goal, &p, 0, &s, now) != ROLN_OK) memset(now, 0, sizeof now);
        for (int j = 0; j < MOTORS; j++) {
            now[j] = (roln_real)fmax(-limit, fmin(limit, (double)now[j]));
            cost += SWIFT_U(limit) * (double)(now[j] * now[j]);
            if (u) u[k * MOTORS + j] = now[j];
        }
        to_joints(now, tau);
        if (swift_step(&params, &s, tau, (roln_real)SWIFT_DT, &work.step) != ROLN_OK) return INFINITY;
        if (swift_decode(&params, &s, &x, &work.decode) != ROLN_OK) return INFINITY;
        for (int i = 0; i < N; i++)
            cost += SWIFT_Q * pow((double)(x.q[i] - w->q[i]), 2) + SWIFT_QD * pow((double)x.qd[i], 2);
    }
    return cost;
}

static int larger(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void many(int count)
{
    enum { EACH = 50, MOST = 2000 };
    static double ratio[MOST];
    static wish w;
    uint64_t seed = 1;
    int better = 0, lost = 0;
    memset(&seen, 0, sizeof seen);
    for (int k = 0; k < count; k++) {
        const double limit = (double)(roln_real)exp(uniform(&seed, log(8.), log(40.)));
        const swift_latent s = draw(&seed, NULL);
        double with, without;
        wish_start(&w, limit, 0);
        with = run(&w, limit, s, EACH, (uint64_t)k + 1, NULL), without = run(&w, 1e4 * limit, s, EACH, (uint64_t)k + 1, NULL);
        ratio[k] = isfinite(with) ? without / with : 0, better += with <= without, lost += !isfinite(without);
    }
    qsort(ratio, (size_t)count, sizeof ratio[0], larger);
    printf("\n%d plans, another pose every %d, limits of 8 to 40 Nm: %d reach theirs, %d torques are beyond it, %d were refused\n",
           seen.plans, CHANGE, seen.full, seen.beyond, seen.refused);
    printf("plans that know no limit, clipped: cost of 1 s over that of plans with limits: median %.3f; lower in %d of %d; the "
           "model could not follow %d\n", ratio[count / 2], count - better, count, lost);
    CHECK(seen.beyond == 0);
    CHECK(seen.refused < 0.01 * seen.plans);
    CHECK(seen.full > 0.3 * seen.plans);
    CHECK(ratio[count / 2] > 1);
    CHECK(better > 0.9 * count);
}

/* ---- 4 the best that is found offline ---- */

static void best(int count)
{
    static double more[100];
    static float u[OFFLINE_STEPS * MOTORS];
    static wish w;
    roln_real K[MOTORS * 2 * n];
    uint64_t seed = 7;
    int lost = 0;
    for (int k = 0; k < count; k++) {
        struct offline o;
        swift_latent end = {{0}, {0}};
        swift_state x;
        const double limit = (double)(roln_real)exp(uniform(&seed, log(15.), log(60.)));
        const swift_latent s = draw(&seed, NULL);
        const roln_cost cost = {w.weight, w.slow, w.dear, (roln_real)SWIFT_DT, &motors};
        double done, least;
        wish_start(&w, limit, 0);
        memset(x.q, 0, sizeof x.q), memset(x.qd, 0, sizeof x.qd); /* to hang, where no torque is wanted */
        if (swift_encode(&params, &x, &end, &work.encode) != ROLN_OK ||
            swift_lqr(&params, &cost, &end, NULL, K, w.P, &lqrwork) != ROLN_OK) exit(1);
        memcpy(w.end, &end, sizeof w.end);
        w.goal.P = w.P, w.goal.end = w.end;
        for (int i = 0; i < 8; i++)
            o.start[i] = (double)(i < n ? s.z[i] : s.zd[i - n]), o.end[i] = (double)w.end[i];
        for (int i = 0; i < N; i++)
            o.q[i] = (double)w.q[i];
        for (int i = 0; i < 64; i++)
            o.P[i] = (double)w.P[i];
        o.limit = limit;
        (void)run(&w, limit, s, OFFLINE_STEPS, 0, u);
        done = offline_cost(&o, u);
        least = offline_best(&o, u);
        memset(u, 0, sizeof u);
        least = fmin(least, offline_best(&o, u));
        more[k] = isfinite(done) ? done / least - 1 : (double)INFINITY; /* infinite: the loop did not hold it */
        lost += !isfinite(done);
    }
    qsort(more, (size_t)count, sizeof more[0], larger);
    printf("\ncost of the loop above that of all %d steps at once, iterated to the end in double, %d starts: median %.2f %%, 95 %% "
           "below %.2f %%, %d lost\n", OFFLINE_STEPS, count, 100 * more[count / 2], 100 * more[count * 95 / 100], lost);
    CHECK_BELOW(more[count / 2], 0.05);
    CHECK_BELOW(more[count * 95 / 100], 0.2);
}

int main(int argc, char **argv)
{
    const int test = argc > 1 && strcmp(argv[1], "test") == 0;
    if (load(CONTROL_MODEL)) return 1;
    references(test ? 1 : 3, test ? 6 : 20);
    many(test ? 40 : 2000);
    best(test ? 10 : 100);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
