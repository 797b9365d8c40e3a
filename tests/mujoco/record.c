/* SPDX-License-Identifier: MIT */
/* record - any machine that MuJoCo can load, moved at random and recorded: what a model is learned from.

     record MODEL.xml OUT [seed=1] [train=N] [test=10] [seconds=2] [dt=S] [speed=1] [effort=1] [next=FILE]

   Written: OUT.csv and OUT_test.csv (columns of examples/train.c), OUT.h5 (demos.h), OUT.h, the config that is proposed,
   OUT_full.h, a config of all joints, OUT_angles.h, the config with all hinges as angles if that is possible and differs,
   OUT_constant.csv, E_q of the motion carried on at constant velocity, q + h qd, on the recordings of OUT_test.csv.
   Joints are hinges and sliders. Ball and free joints are refused: their positions are quaternions, which are no q with qd = dq/dt,
   and rotation vectors, which are, jump at a half turn.

   Time: a sample takes dt, by default 1 ms, or 2 ms if the timestep of the model is 2 ms or more. The integrator is the model's
   own. A sample takes so many steps that twice as many change the motion by less than 0.1 %, or 32.

   Kinds of recordings, in turn: free falls; forces of the motors that are random sines; motors under a PD controller, with the
   machine's own M and bias, that follow random references. If motors can move every joint, only one recording in six falls, and the
   sines act beside the forces that hold the machine. Servos get random sines as commands, which begin at their own position.
   speed= and effort= scale the speeds and the forces that the ranges of joints and motors suggest.
   Start: a machine of 12 joints at most without equalities starts in a random pose, at rest. A joint that neither gravity nor a
   spring moves gets a random velocity. All other machines start at their reference pose and swing for up to a second, in a gravity
   that is tilted and stretched, with motors. This keeps chains closed and moves soft bodies as a whole.
   next=FILE: behind the other recordings for training those that the trainer wants, OUT_next.csv. Each begins where its first row
   says. Motors exert its torques and, under a PD controller, follow its motion. Servos follow nothing: random sines move them.
   Those that cannot be recorded are counted. Refused with equalities and taut strings, which a start would break.
   A recording begins where no limit and no contact acts, and ends where one begins to act: a stop is an impact. A tendon that is
   taut at rest, such as a string under a weight, acts in all recordings, which end where it is slack.
   Recordings that are unstable, too short or do not move are dropped and counted by cause. If three of four are dropped, all is
   repeated with one change: without contacts, more gently, with more effort, or with shorter recordings.
   tau: force of the motors on the joints, mean over the interval to the next sample, 0 of a joint without motor.
   Exit code 1: the last line says why. */
#define _XOPEN_SOURCE 700 /* realpath */
#include <errno.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "machine.h"
#include "newer.h"

#define FAST 1e4    /* rad/s or m/s: a machine out of hand */
#define CHANGE 1e-3 /* of the motion, by half the step: nothing */
enum { SMALL = 12, TERMS = 3, TRIES = 10, MOST_STEPS = 32 };

void fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    fflush(stdout);
    fputs("record: ", stderr);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    va_end(list);
    exit(1);
}

void *room(size_t bytes)
{
    void *p = calloc(1, bytes ? bytes : 1);
    if (!p) fail("out of memory: %zu bytes\nhint: fewer or shorter recordings: train=10 seconds=1", bytes);
    return p;
}

/* A file that cannot be written. */
void refuse_place(const char *path)
{
    fail("cannot write %s: %s\nhint: OUT names another place, which must be there; it needs room", path, strerror(errno));
}

/* ---- settings ---- */

static struct {
    const char *key;
    double value, low, high;
} settings[] = {{"seed", 1, 0, 1e15}, {"train", 0, 0, 1e5},    {"test", 10, 1, 1e5},    {"seconds", 2, 0.1, 3600},
                {"dt", 0, 0, 1},      {"speed", 1, 1e-3, 100}, {"effort", 1, 1e-3, 100}};
enum { SEED, TRAIN, TEST, SECONDS, DT, SPEED, EFFORT, SETTINGS };
static const char *next_path; /* next=, or NULL */

static void read_settings(int argc, char **argv)
{
    for (int i = 3; i < argc; i++) {
        int k = 0;
        char *eq = strchr(argv[i], '='), *end;
        if (strncmp(argv[i], "next=", 5) == 0) {
            next_path = argv[i] + 5;
            continue;
        }
        while (k < SETTINGS && (!eq || strlen(settings[k].key) != (size_t)(eq - argv[i]) ||
                                strncmp(argv[i], settings[k].key, strlen(settings[k].key))))
            k++;
        if (k == SETTINGS)
            fail("%s: no setting\nhint: one of seed=, train=, test=, seconds=, dt=, speed=, effort=, next=", argv[i]);
        const double x = strtod(eq + 1, &end);
        if (end == eq + 1 || *end || !(x >= settings[k].low && x <= settings[k].high))
            fail("%s: expected a number\nhint: %s=%g .. %g", argv[i], settings[k].key, settings[k].low, settings[k].high);
        settings[k].value = x;
    }
}

/* ---- random numbers: splitmix64, one stream a recording ---- */

static uint64_t mix(uint64_t x)
{
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

static double uniform(uint64_t *state, double low, double high)
{
    *state += UINT64_C(0x9e3779b97f4a7c15);
    return low + (high - low) * ((double)(mix(*state) >> 11) * 0x1p-53);
}

/* ---- the machine ---- */

struct machine rig;

static void on_error(const char *message)
{
    fail("MuJoCo: %s", message);
}
static void on_warning(const char *message)
{
    (void)message; /* counted in d->warning */
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static const char *name_in(int type, int id)
{
    const char *name = mj_id2name(rig.m, type, id);
    return name ? name : "";
}

static const char *joint_name(int j)
{
    return name_in(mjOBJ_JOINT, j);
}

static void load(const char *path)
{
    char error[1000] = "";
    mju_user_error = on_error;
    mju_user_warning = on_warning;
    FILE *f = fopen(path, "r");
    if (!f) fail("cannot read %s: %s\nhint: check the path", path, strerror(errno));
    fclose(f);
    rig.m = mj_loadXML(path, NULL, error, sizeof error);
    for (char *c = error; *c; c++)
        if (*c == '\n') *c = ' ';
    if (!rig.m) fail("%s: %s%s", path, error, newer_hint(error));
    const mjModel *m = rig.m;
    for (int j = 0; j < m->njnt; j++) {
        const int ball = m->jnt_type[j] == mjJNT_BALL;
        if (ball || m->jnt_type[j] == mjJNT_FREE)
            fail("%s: joint %d %s is %s: its quaternion is no q with qd = dq/dt\nhint: write three hinges%s in its place", path,
                 j + 1, joint_name(j), ball ? "a ball joint" : "free", ball ? "" : " and three sliders");
    }
    if (m->nv == 0) fail("%s: there are no joints\nhint: the model needs a hinge or a slider", path);
    if (m->nv > 1000) fail("%s: %d joints, more than 1000\nhint: take joints out", path, m->nv);
    rig.m->opt.jacobian = mjJAC_DENSE;
    rig.d = mj_makeData(m);
    if (!rig.d) fail("%s: out of memory\nhint: a smaller model", path);
}

/* A motor whose force is its command times a gain. */
static int plain(int a)
{
    const mjModel *m = rig.m;
    return m->actuator_gaintype[a] == mjGAIN_FIXED && m->actuator_gainprm[a * mjNGAIN] != 0 &&
           m->actuator_biastype[a] == mjBIAS_NONE && m->actuator_dyntype[a] == mjDYN_NONE;
}

/* A servo of positions, and one of velocities: the command at which its force is 0 is `zero` times its length or its speed. */
static int servo(int a, int of_speed, double *zero)
{
    const mjModel *m = rig.m;
    const double *gain = m->actuator_gainprm + a * mjNGAIN, *bias = m->actuator_biasprm + a * mjNBIAS;
    if (m->actuator_gaintype[a] != mjGAIN_FIXED || gain[0] == 0 || m->actuator_biastype[a] != mjBIAS_AFFINE) return 0;
    if (m->actuator_dyntype[a] == mjDYN_INTEGRATOR) return 0;
    *zero = -bias[of_speed ? 2 : 1] / gain[0];
    return of_speed ? bias[1] == 0 && bias[2] != 0 : bias[1] != 0;
}

static int limited(int j)
{
    return rig.m->jnt_limited[j];
}
int hinge(int j)
{
    return rig.m->jnt_type[j] == mjJNT_HINGE;
}

/* A hinge without spring: all that acts on it may repeat after a turn. */
int periodic(int j)
{
    const mjModel *m = rig.m;
    int is = hinge(j) && m->jnt_stiffness[j] <= 0;
    for (int t = 0; t < m->ntendon; t++)
        for (int w = m->tendon_adr[t]; w < m->tendon_adr[t] + m->tendon_num[t]; w++)
            is &= !(m->wrap_type[w] == mjWRAP_JOINT && m->wrap_objid[w] == j && m->tendon_stiffness[t] > 0);
    return is;
}

/* A hinge that may turn round. */
static int circles(int j)
{
    return periodic(j) && !limited(j);
}

/* Half the width of what a joint may move, and its middle. */
static double reach(int j)
{
    const mjModel *m = rig.m;
    if (limited(j)) return (m->jnt_range[2 * j + 1] - m->jnt_range[2 * j]) / 2;
    return hinge(j) ? (circles(j) ? PI : 1) : 0.25 * m->stat.extent;
}

static double middle(int j)
{
    const double *r = rig.m->jnt_range + 2 * j;
    return limited(j) ? (r[0] + r[1]) / 2 : rig.m->qpos0[j];
}

static double pose(int j, uint64_t *state)
{
    return middle(j) + 0.8 * rig.spread * reach(j) * uniform(state, -1, 1);
}

/* A joint crosses its range in a second, a hinge with limits turns by half a turn at most. */
static double suited_speed(int j)
{
    return settings[SPEED].value * (hinge(j) && limited(j) ? fmin(2 * reach(j), PI) : 2 * reach(j));
}

/* The force that a motor can give at most, by its ranges; 0: nothing limits it. */
static double strongest(int a)
{
    const mjModel *m = rig.m;
    const double *c = m->actuator_ctrlrange + 2 * a, *f = m->actuator_forcerange + 2 * a;
    double most = 0;
    if (m->actuator_forcelimited[a]) most = fmax(fabs(f[0]), fabs(f[1]));
    if (plain(a) && m->actuator_ctrllimited[a]) {
        const double x = fabs(m->actuator_gainprm[a * mjNGAIN]) * fmax(fabs(c[0]), fabs(c[1]));
        most = most > 0 ? fmin(most, x) : x;
    }
    return most;
}

/* Forces that move the machine well: half of what gravity does at twenty poses, dry friction, and an acceleration of 15 reaches a
   second^2. Joints that nothing moves by itself. */
static void measure(void)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    uint64_t state = 7;
    double *M = room((size_t)(m->nv * m->nv) * sizeof *M), *falls = room((size_t)m->nv * sizeof *falls);
    mj_resetData(m, d);
    for (int k = 0; k <= 20; k++) {
        for (int j = 0; j < m->nv && k < 20; j++)
            d->qpos[j] = pose(j, &state);
        if (k == 20) mj_resetData(m, d);
        mj_forward(m, d);
        for (int j = 0; j < m->nv; j++) {
            rig.force[j] = fmax(rig.force[j], fabs(d->qfrc_bias[j]) / 2);
            falls[j] = fmax(falls[j], fabs(d->qfrc_bias[j] - d->qfrc_passive[j]));
        }
    }
    mj_fullM(m, M, d->qM);
    for (int j = 0; j < m->nv; j++) {
        const double inertia = reach(j) * M[j * (m->nv + 1)];
        rig.still[j] = falls[j] < 0.05 * inertia + m->dof_frictionloss[j];
        rig.force[j] = settings[EFFORT].value * (rig.force[j] + 15 * inertia) + 2 * m->dof_frictionloss[j];
        rig.speed[j] = suited_speed(j);
    }
    free(M), free(falls);
}

/* What motors can do, as they stand in the pose that the model begins in. */
static void measure_motors(void)
{
    const mjModel *m = rig.m;
    int *moved = room((size_t)m->nv * sizeof *moved), all = 0;
    for (int a = 0; a < m->nu; a++) {
        const double *row = memcpy(rig.moment + a * m->nv, rig.d->actuator_moment + a * m->nv, (size_t)m->nv * sizeof *row);
        double sum = 0, rate = 0, square = 1e-300;
        for (int j = 0; j < m->nv; j++) {
            sum += fabs(row[j]) * rig.force[j], rate += row[j] * row[j] * rig.speed[j] * rig.speed[j], square += row[j] * row[j];
            moved[j] |= row[j] != 0;
        }
        rig.pull[a] = square > 1e-200 ? sum / square : 1;
        if (strongest(a) > 0) rig.pull[a] = fmin(rig.pull[a], fmin(1, settings[EFFORT].value) * strongest(a));
        rig.rate[a] = sqrt(rate);
        rig.servos += !plain(a);
    }
    for (int j = 0; j < m->nv; j++)
        all += moved[j];
    rig.full = m->nu >= m->nv && all == m->nv;
    free(moved);
}

/* Nonzero if a row of constraints is the limit of a joint (of a tendon) and acts; name: its own. */
static int limit_acts(int row, int of_tendon, const char **name)
{
    const mjData *d = rig.d;
    if (d->efc_type[row] != (of_tendon ? mjCNSTR_LIMIT_TENDON : mjCNSTR_LIMIT_JOINT)) return 0;
    *name = name_in(of_tendon ? mjOBJ_TENDON : mjOBJ_JOINT, d->efc_id[row]);
    return 1;
}

/* Tendons whose limits act. */
static int taut(void)
{
    const char *name;
    int count = 0;
    for (int i = 0; i < rig.d->nefc; i++)
        count += limit_acts(i, 1, &name);
    return count;
}

/* Does a limit act, but for tendons that are taut at rest? */
static int stops(void)
{
    const mjData *d = rig.d;
    const char *name = "";
    for (int i = 0; i < d->nefc; i++)
        if (limit_acts(i, 0, &name) || (rig.taut == 0 && limit_acts(i, 1, &name))) {
            snprintf(rig.where, sizeof rig.where, "the limit of %s %d %s",
                     d->efc_type[i] == mjCNSTR_LIMIT_JOINT ? "joint" : "tendon", d->efc_id[i] + 1, name);
            return 1;
        }
    if (taut() >= rig.taut) return 0;
    snprintf(rig.where, sizeof rig.where, "slack of a tendon that is taut at rest");
    return 1;
}

/* Does a contact push? */
static int touches(void)
{
    const mjData *d = rig.d;
    for (int i = 0; i < d->nefc; i++)
        if (d->efc_type[i] >= mjCNSTR_CONTACT_FRICTIONLESS && d->efc_force[i] != 0) {
            const mjContact *c = d->contact + d->efc_id[i];
            snprintf(rig.where, sizeof rig.where, "a contact of geoms %d %s and %d %s", c->geom1 + 1, name_in(mjOBJ_GEOM, c->geom1),
                     c->geom2 + 1, name_in(mjOBJ_GEOM, c->geom2));
            return 1;
        }
    return 0;
}

/* Lets the machine come to rest in its reference pose, and counts the tendons that are taut there. */
void find_strings(void)
{
    mjData *d = rig.d;
    int limits = 0;
    for (int t = 0; t < rig.m->ntendon; t++)
        limits += rig.m->tendon_limited[t];
    mj_resetData(rig.m, d);
    rig.taut = 0;
    for (int k = 0; k < 4000 && limits > 0; k++) {
        mj_step(rig.m, d);
        mju_scl(d->qvel, d->qvel, 0.98, rig.m->nv);
    }
    if (limits > 0) rig.taut = taut();
}

static void measure_all(void)
{
    const mjModel *m = rig.m;
    const size_t number = sizeof(double), joints = (size_t)m->nv, motors = (size_t)m->nu;
    const double want = m->opt.timestep >= 2e-3 ? 2e-3 : 1e-3;
    rig.force = room(joints * number), rig.speed = room(joints * number), rig.want = room(2 * joints * number);
    rig.still = room(joints * sizeof(int)), rig.angle = room(joints * sizeof(int));
    rig.pull = room(motors * number), rig.rate = room(motors * number), rig.moment = room(motors * joints * number);
    rig.full_samples = room(motors * sizeof(int)), rig.full_now = room(motors * sizeof(int));
    measure();
    measure_motors();
    rig.columns = m->nu > 0 ? m->nv : 0;
    rig.dt = settings[DT].value > 0 ? settings[DT].value : want;
    rig.steps = (int)ceil(rig.dt / fmin(m->opt.timestep, 2e-3) - 1e-6);
    rig.m->opt.timestep = rig.dt / rig.steps;
    find_strings();
}

/* ---- what moves it ---- */

enum { SHORTEST = 20 }; /* samples of a recording */
enum { FALL, SINES, PD, KINDS, FOLLOW = KINDS };

typedef struct {
    int kind;
    const demo *wanted; /* FOLLOW: its start, and with forces its samples; else NULL */
    double w, zeta;     /* of the controller */
    double *size, *frequency, *phase; /* [motors or joints][TERMS] */
    double *offset, *fade; /* [motors or joints] what is added at first, and in what time it fades, s: no command jumps */
} drive;

/* The kind of recording k: falls are a third, or a sixth if motors move every joint. */
static int kind_of(int k)
{
    static const int driven[] = {PD, SINES, PD, FALL, PD, SINES};
    return rig.m->nu == 0 ? FALL : rig.full ? driven[k % 6] : k % KINDS;
}

/* The size of what motor a is told, and the speed that it is not to exceed, 0: none. */
static double size_of(int a, double *rate)
{
    const mjModel *m = rig.m;
    const double *range = m->actuator_ctrlrange + 2 * a;
    double size = 0, zero;
    *rate = 0;
    if (servo(a, 0, &zero)) {
        for (int j = 0; j < m->nv; j++)
            size = fmax(size, fabs(rig.moment[a * m->nv + j]) * 0.7 * reach(j));
        size *= fabs(zero), *rate = fabs(zero) * rig.rate[a];
    } else if (servo(a, 1, &zero)) {
        size = fabs(zero) * rig.rate[a];
    } else {
        return rig.pull[a];
    }
    return m->actuator_ctrllimited[a] ? fmin(size, 0.45 * (range[1] - range[0])) : size;
}

static void draw_drive(drive *v, int kind, uint64_t *state)
{
    double zero;
    for (int a = 0; a < rig.m->nu; a++) /* a servo does not let the machine fall */
        if (servo(a, 0, &zero) || servo(a, 1, &zero)) kind = SINES;
    if ((kind == PD || kind == FOLLOW) && rig.servos) kind = SINES;
    const int n = kind == PD ? rig.m->nv : rig.m->nu;
    v->kind = kind, v->w = uniform(state, 4, 12), v->zeta = uniform(state, .6, 1);
    for (int i = 0; i < n; i++) {
        double most = 0, all = kind == PD ? 0.7 * reach(i) : size_of(i, &most), rate = 0;
        const double own = all * rig.spread * uniform(state, .3, 1), haste = uniform(state, .4, 1);
        if (kind == PD) most = rig.speed[i];
        for (int k = 0; k < TERMS; k++) {
            const int at = i * TERMS + k;
            v->size[at] = own * uniform(state, .5, 1) * 2 / TERMS / (k + 1);
            v->frequency[at] = most > 0 ? uniform(state, .1, .5) * (k + 1) : uniform(state, .2, 2);
            v->phase[at] = uniform(state, 0, 2 * PI);
            rate += v->size[at] * 2 * PI * v->frequency[at];
        }
        for (int k = 0; k < TERMS && most > 0 && rate > most * haste; k++)
            v->frequency[i * TERMS + k] *= most * haste / rate;
        v->offset[i] = 0, v->fade[i] = 1;
    }
}

/* Sum of sines i at t, and its rate. */
static double sines(const drive *v, int i, double t, double *rate)
{
    const double fading = v->offset[i] * exp(-t / v->fade[i]);
    double x = fading;
    *rate = -fading / v->fade[i];
    for (int k = i * TERMS; k < (i + 1) * TERMS; k++) {
        const double w = 2 * PI * v->frequency[k];
        x += v->size[k] * sin(w * t + v->phase[k]), *rate += v->size[k] * w * cos(w * t + v->phase[k]);
    }
    return x;
}

/* rig.want = M a + tau, a the acceleration that leads joints back to what is wanted at t, tau its forces. */
static void follow(const drive *v, double t)
{
    const mjModel *m = rig.m;
    const int i = (int)fmin(t / rig.dt + 0.5, v->wanted->samples - 1);
    const double *x = v->wanted->row + (size_t)i * (size_t)(1 + 2 * m->nv + rig.columns) + 1;
    double *a = rig.want + m->nv;
    for (int j = 0; j < m->nv; j++)
        a[j] = v->w * v->w * (x[j] - rig.d->qpos[j]) + 2 * v->zeta * v->w * (x[m->nv + j] - rig.d->qvel[j]);
    mj_mulM(m, rig.d, rig.want, a);
    mju_addTo(rig.want, x + 2 * m->nv, m->nv);
}

/* rig.want = M a + bias, a the acceleration that leads joints with motors back to their references: computed torque. Without
   references a is 0, and rig.want is what holds the machine. */
static void want(const drive *v, double t)
{
    const mjModel *m = rig.m;
    const mjData *d = rig.d;
    double *a = rig.want + m->nv;
    for (int j = 0; j < m->nv; j++) {
        double rate, x = v->kind == PD ? middle(j) + sines(v, j, t, &rate) : 0;
        int moved = 0;
        for (int k = 0; k < m->nu; k++)
            moved |= d->actuator_moment[k * m->nv + j] != 0;
        a[j] = moved && v->kind == PD ? v->w * v->w * (x - d->qpos[j]) + 2 * v->zeta * v->w * (rate - d->qvel[j]) : 0;
    }
    mj_mulM(m, d, rig.want, a);
    mju_addTo(rig.want, d->qfrc_bias, m->nv);
    mju_subFrom(rig.want, d->qfrc_passive, m->nv);
}

/* The middle of what a servo is told. */
static double rest_of(int a, double zero)
{
    const mjModel *m = rig.m;
    const double *range = m->actuator_ctrlrange + 2 * a;
    double x = 0;
    for (int j = 0; j < m->nv; j++)
        x += rig.moment[a * m->nv + j] * (middle(j) - m->qpos0[j]);
    x = zero * (m->actuator_length0[a] + x);
    return m->actuator_ctrllimited[a] ? fmin(fmax(x, 0.55 * range[0] + 0.45 * range[1]), 0.45 * range[0] + 0.55 * range[1]) : x;
}

/* What a servo needs beyond its own position to hold the machine against gravity: rig.want is the force that does. */
static double hold(int a)
{
    const double *row = rig.d->actuator_moment + a * rig.m->nv;
    double force = 0, square = 1e-300;
    for (int j = 0; j < rig.m->nv; j++)
        if (row[j] != 0) force += row[j] * rig.want[j], square += row[j] * row[j];
    return force / square / rig.m->actuator_gainprm[a * mjNGAIN];
}

/* Commands and references begin where the machine is. */
static void begin(drive *v)
{
    const mjData *d = rig.d;
    const int n = v->kind == PD ? rig.m->nv : v->kind == SINES ? rig.m->nu : 0;
    if (v->kind == SINES) want(v, 0);
    for (int i = 0; i < n; i++) {
        double rate, zero, x;
        if (v->kind == PD) x = d->qpos[i] - middle(i), rate = rig.speed[i];
        else if (servo(i, 0, &zero)) x = zero * d->actuator_length[i] + hold(i) - rest_of(i, zero), rate = fabs(zero) * rig.rate[i];
        else continue;
        double unused;
        v->offset[i] = x - sines(v, i, 0, &unused);
        v->fade[i] = fmax(0.3, fabs(v->offset[i]) / (rate > 0 ? rate : 1));
    }
}

/* What a servo, or a motor with dynamics, is told: sines within its range. */
static double command_of(const drive *v, int a, double t)
{
    const double *range = rig.m->actuator_ctrlrange + 2 * a;
    double rate, zero, u;
    if (servo(a, 0, &zero)) return v->kind == SINES ? rest_of(a, zero) + sines(v, a, t, &rate) : rest_of(a, zero);
    if (servo(a, 1, &zero)) return v->kind == SINES ? sines(v, a, t, &rate) : 0;
    u = v->kind == SINES ? sines(v, a, t, &rate) / rig.pull[a] : 0;
    return rig.m->actuator_ctrllimited[a] ? (range[0] + range[1] + (range[1] - range[0]) * u) / 2 : u;
}

/* What the motors are told for the next sample; positions and velocities of d are computed. A force falls with the speed, as
   that of a real motor does. */
static void command(const drive *v, double t)
{
    const mjModel *m = rig.m;
    const int holds = v->kind == PD || v->kind == FOLLOW || (v->kind == SINES && rig.full && !rig.servos);
    if (v->kind == FOLLOW) follow(v, t);
    else if (holds) want(v, t);
    for (int a = 0; a < m->nu; a++) {
        const double *row = rig.d->actuator_moment + a * m->nv, *range = m->actuator_ctrlrange + 2 * a;
        const int ranged = m->actuator_ctrllimited[a];
        double u = 0, rate, square = 1e-300;
        if (!plain(a)) {
            u = command_of(v, a, t);
        } else if (v->kind != FALL) {
            for (int j = 0; j < m->nv && holds; j++)
                if (row[j] != 0) u += row[j] * rig.want[j], square += row[j] * row[j];
            u = holds ? u / square : 0;
            if (v->kind == SINES) u += sines(v, a, t, &rate) - rig.pull[a] * rig.d->actuator_velocity[a] / (rig.rate[a] + 1e-300);
            u /= m->actuator_gainprm[a * mjNGAIN];
        }
        const double part = plain(a) && range[0] <= 0 && range[1] >= 0 ? fmin(1, settings[EFFORT].value) : 1;
        rig.d->ctrl[a] = ranged ? fmin(fmax(u, part * range[0]), part * range[1]) : u;
    }
}

/* ---- a recording ---- */

/* Nonzero, and rig.why says it. */
static int unstable(void)
{
    const char *why = NULL;
    for (int i = 0; i < rig.m->nv && !why; i++)
        if (!(fabs(rig.d->qvel[i]) < FAST)) why = "velocities out of hand";
    for (int i = 0; i < mjNWARNING; i++)
        if (rig.d->warning[i].number && i != mjWARN_VGEOMFULL) why = mju_warningText(i, rig.d->warning[i].lastinfo);
    if (why) snprintf(rig.why, sizeof rig.why, "%s", why);
    return why != NULL;
}

/* A sample on, from time t of the drive: nonzero if that is unstable. force: NULL, or the mean of the motors' over it. */
static int sample(const drive *v, double t, double *force)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    for (int i = 0; i < rig.columns && force; i++)
        force[i] = 0;
    mj_fwdPosition(m, d), mj_fwdVelocity(m, d);
    command(v, t);
    for (int s = 0; s < rig.steps; s++) {
        mj_step(m, d);
        if (unstable()) return 1;
        rig.touched |= touches(), rig.stopped |= stops();
        for (int i = 0; i < rig.columns && force; i++)
            force[i] += d->qfrc_actuator[i] / rig.steps;
        if (rig.touched || rig.stopped) break;
    }
    return 0;
}

static void start(uint64_t *state, drive *v)
{
    mjModel *m = rig.m;
    mjData *d = rig.d;
    mj_resetData(m, d);
    if (v->wanted) {
        memcpy(d->qpos, v->wanted->row + 1, (size_t)m->nv * sizeof *d->qpos);
        memcpy(d->qvel, v->wanted->row + 1 + m->nv, (size_t)m->nv * sizeof *d->qvel);
        return;
    }
    if (m->nv <= SMALL && m->neq == 0 && rig.taut == 0) {
        for (int j = 0; j < m->nv; j++)
            d->qpos[j] = pose(j, state);
        for (int j = 0; j < m->nv; j++)
            if (v->kind == FALL && rig.still[j]) d->qvel[j] = rig.spread * rig.speed[j] * uniform(state, -1, 1);
        return;
    }
    const mjOption own = m->opt;
    const double up = uniform(state, -1, 1), around = uniform(state, 0, 2 * PI), flat = sqrt(1 - up * up);
    const double g = mju_norm3(own.gravity) > 0 ? mju_norm3(own.gravity) : 9.81, end = uniform(state, .2, 1);
    const double size = rig.spread * g * (rig.taut > 0 ? 0.5 : 1); /* a string stays taut */
    const double off[3] = {size * flat * cos(around), size * flat * sin(around), size * up};
    mju_addTo3(m->opt.gravity, off);
    while (d->time < end && !unstable())
        sample(v, d->time, NULL);
    m->opt.gravity[0] = own.gravity[0], m->opt.gravity[1] = own.gravity[1], m->opt.gravity[2] = own.gravity[2];
    d->time = 0;
}

/* From a start to where neither a limit nor a contact acts: nonzero if that takes longer than `most` samples, or is unstable. */
static int leave(const drive *v, int most)
{
    mj_forward(rig.m, rig.d);
    if (unstable()) return UNSTABLE + 1;
    for (int k = 0; k <= most; k++) {
        rig.touched = touches(), rig.stopped = stops();
        if (!rig.touched && !rig.stopped) return 0;
        if (sample(v, k * rig.dt, NULL)) return UNSTABLE + 1;
    }
    return rig.touched ? TOUCHED + 1 : STOPPED + 1;
}

/* Counts motors that give all they have. */
static void count_full(void)
{
    const mjModel *m = rig.m;
    for (int a = 0; a < m->nu; a++) {
        const double *c = m->actuator_ctrlrange + 2 * a, u = rig.d->ctrl[a], most = strongest(a);
        const int at_end = plain(a) && m->actuator_ctrllimited[a] && c[1] > c[0] && (u <= c[0] || u >= c[1]);
        rig.full_now[a] += at_end || (most > 0 && fabs(rig.d->actuator_force[a]) >= 0.999 * most);
    }
}

/* Samples of a recording in row [most][wide], or minus what was wrong, minus 1. */
static int record(int kind, uint64_t *state, drive *v, int most, double *row)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    const int N = m->nv, wide = 1 + 2 * N + rig.columns;
    int k = 0, stuck;
    memset(rig.full_now, 0, (size_t)m->nu * sizeof *rig.full_now);
    draw_drive(v, kind, state);
    start(state, v);
    if ((stuck = leave(v, v->wanted ? 0 : most / 2))) return -stuck;
    begin(v);
    for (; k < most && !rig.stopped && !rig.touched; k++) {
        double *to = row + k * wide;
        to[0] = k * rig.dt;
        memcpy(to + 1, d->qpos, (size_t)N * sizeof *to), memcpy(to + 1 + N, d->qvel, (size_t)N * sizeof *to);
        if (sample(v, k * rig.dt, to + 1 + 2 * N)) return -UNSTABLE - 1;
        count_full();
    }
    k -= rig.stopped || rig.touched;
    if (k < (v->wanted ? SHORTEST : rig.least)) return rig.touched ? -TOUCHED - 1 : -STOPPED - 1;
    for (int j = 0; j < N; j++) { /* it moves if one joint moves by half a per cent of its reach */
        double low = row[1 + j], high = low;
        for (int i = 1; i < k; i++)
            low = fmin(low, row[i * wide + 1 + j]), high = fmax(high, row[i * wide + 1 + j]);
        if (high - low > 5e-3 * reach(j)) return k;
    }
    return -STILL - 1;
}

/* ---- steps ---- */

/* What twice as many steps change in a quarter of a second, as a part of the motion; HUGE_VAL: unstable. */
static double change_of(drive *v, int kind, uint64_t seed, int most, double *row)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    const int N = m->nv, wide = 2 * N;
    double *q = room((size_t)(2 * N + m->na + 1) * sizeof *q), off = 0;
    int k, count = most, broke = 0;
    draw_drive(v, kind, &seed);
    start(&seed, v);
    if (leave(v, most)) count = 0;
    else begin(v);
    memcpy(q, d->qpos, (size_t)N * sizeof *q), memcpy(q + N, d->qvel, (size_t)N * sizeof *q);
    memcpy(q + wide, d->act, (size_t)m->na * sizeof *q);
    for (int fine = 0; fine < 2 && count > 0; fine++) {
        mj_resetData(m, d);
        memcpy(d->qpos, q, (size_t)N * sizeof *q), memcpy(d->qvel, q + N, (size_t)N * sizeof *q);
        memcpy(d->act, q + wide, (size_t)m->na * sizeof *q);
        rig.steps *= 1 + fine, rig.m->opt.timestep = rig.dt / rig.steps;
        rig.touched = rig.stopped = 0;
        for (k = 0; k < count && !rig.touched && !rig.stopped; k++) {
            if ((broke = sample(v, k * rig.dt, NULL))) break;
            memcpy(row + (fine * most + k) * wide, d->qpos, (size_t)N * sizeof *q);
            memcpy(row + (fine * most + k) * wide + N, d->qvel, (size_t)N * sizeof *q);
        }
        count = broke ? 0 : k - (rig.touched || rig.stopped);
        if (fine) rig.steps /= 2, rig.m->opt.timestep = rig.dt / rig.steps;
    }
    for (int i = 0; i < wide && count > 0; i++) { /* of each joint, q and qd */
        const double scale = i < N ? reach(i) : rig.speed[i - N];
        double error = 0, size = 1e-4 * scale * scale * count;
        for (k = 0; k < count; k++) {
            const double x = row[k * wide + i], e = row[(most + k) * wide + i] - x, moved = x - (i < N ? q[i] : 0);
            error += e * e, size += moved * moved;
        }
        off += error / size / wide;
    }
    free(q);
    return broke ? HUGE_VAL : sqrt(off);
}

/* Steps of a sample: so many that twice as many change nothing. */
static void choose_steps(drive *v)
{
    const int most = (int)fmax(20, 0.25 / rig.dt);
    double *row = room((size_t)(4 * most * rig.m->nv) * sizeof *row);
    for (;; rig.steps *= 2) {
        rig.m->opt.timestep = rig.dt / rig.steps;
        rig.step_error = 0;
        for (int k = 0; k < 6; k++) {
            const double change = change_of(v, kind_of(k), mix((uint64_t)(k + 99)), most, row);
            rig.step_error = fmax(rig.step_error, change);
            if (!(change < CHANGE)) break;
        }
        if (rig.step_error < CHANGE || rig.steps * 2 > MOST_STEPS) break;
    }
    free(row);
}

/* ---- recordings ---- */

/* A line a second at most. */
static void progress(int k, int count)
{
    if (now() - rig.told < 1) return;
    rig.told = now();
    printf("  recording %d of %d, %.0f s\n", k + 1, count, rig.told - rig.began);
    fflush(stdout);
}

static int lost(void)
{
    int sum = 0;
    for (int i = 0; i < LOSSES; i++)
        sum += rig.lost[i];
    return sum;
}

static void keep(demos *to, int samples, int test, const double *row)
{
    const int wide = 1 + 2 * rig.m->nv + rig.columns;
    int turned = 0;
    for (int j = 0; j < rig.m->nv; j++)
        for (int i = 0; i < samples; i++)
            if (periodic(j) && fabs(row[i * wide + 1 + j] - rig.m->qpos0[j]) > PI) rig.angle[j] = turned = 1;
    rig.kept++, rig.turns += turned, rig.stops += rig.stopped, rig.contacts += rig.touched;
    for (int a = 0; a < rig.m->nu; a++)
        rig.full_samples[a] += rig.full_now[a];
    if (demos_add(to, samples, test, row)) exit(1);
}

/* All recordings; nonzero: three of four of those begun were lost. */
static int record_all(demos *to, drive *v, const demos *next)
{
    const mjModel *m = rig.m;
    const int train = (int)settings[TRAIN].value, count = train + (int)settings[TEST].value;
    const int most = (int)(settings[SECONDS].value / rig.dt + 0.5) + 1;
    double *row = room((size_t)most * (size_t)(1 + 2 * m->nv + rig.columns) * sizeof *row);
    int bad = 0;
    to->N = m->nv, to->forces = rig.columns, to->inputs = 0, to->dt = rig.dt, to->count = 0, to->demo = NULL;
    rig.stops = rig.contacts = rig.turns = rig.kept = rig.unwilling = 0, *rig.why = 0;
    memset(rig.lost, 0, sizeof rig.lost);
    memset(rig.angle, 0, (size_t)m->nv * sizeof *rig.angle), memset(rig.full_samples, 0, (size_t)m->nu * sizeof(int));
    for (int k = 0; k < count + next->count && !bad; k++)
        for (int again = 0; again < (k < count ? TRIES : 1) && !bad; again++) {
            uint64_t state = mix(mix((uint64_t)settings[SEED].value) + (uint64_t)(k * TRIES + again) + 1);
            v->wanted = k < count ? NULL : &next->demo[k - count];
            const int kind = k < count ? kind_of(k + again) : next->forces > 0 ? FOLLOW : FALL;
            const int longest = kind == FOLLOW && !rig.servos && v->wanted->samples < most ? v->wanted->samples : most;
            const int samples = record(kind, &state, v, longest, row);
            progress(k, count + next->count);
            if (samples > 0) keep(to, samples, k >= train && k < count, row);
            else if (k >= count) rig.unwilling++;
            else rig.lost[-samples - 1]++;
            bad = lost() >= 12 && lost() > 3 * rig.kept;
            if (samples > 0) break;
        }
    free(row);
    return bad || rig.kept < 2;
}

/* ---- main ---- */

static const char *const losses[] = {"were unstable", "met a limit too early", "met a contact too early", "did not move"};

/* Columns of the recordings, joint by joint. */
static void say_joints(const demos *d)
{
    const int N = d->N, wide = demos_wide(d);
    double samples = 0;
    for (int k = 0; k < d->count; k++)
        samples += d->demo[k].samples;
    printf("  joint                     q from        to    qd rms       max   tau rms       max  at full force\n");
    for (int j = 0; j < N && j < 40; j++) {
        double low = HUGE_VAL, high = -HUGE_VAL, v2 = 0, v = 0, t2 = 0, t = 0, full = -1;
        for (int k = 0; k < d->count; k++)
            for (int i = 0; i < d->demo[k].samples; i++) {
                const double *x = d->demo[k].row + i * wide + 1, tau = d->forces ? x[2 * N + j] : 0;
                low = fmin(low, x[j]), high = fmax(high, x[j]);
                v2 += x[N + j] * x[N + j], v = fmax(v, fabs(x[N + j])), t2 += tau * tau, t = fmax(t, fabs(tau));
            }
        for (int a = 0; a < rig.m->nu; a++)
            if (rig.moment[a * N + j] != 0) full = fmax(full, rig.full_samples[a] / samples);
        printf("  %3d %-16.16s %9.3g %9.3g %9.3g %9.3g %9.3g %9.3g  ", j + 1, joint_name(j), low, high, sqrt(v2 / samples), v,
               sqrt(t2 / samples), t);
        if (full < 0) printf("no motor\n");
        else printf("%.1f %%\n", 100 * full);
    }
    if (N > 40) printf("  .. and %d more\n", N - 40);
}

/* The part of the samples in which a joint with dry friction stands, of the joint that stands most. */
static double stands(const demos *d)
{
    const int N = d->N, wide = demos_wide(d);
    double most = 0;
    for (int j = 0; j < N; j++) {
        double count = 0, all = 0;
        for (int k = 0; k < d->count; k++)
            for (int i = 0; i < d->demo[k].samples; i++, all++)
                count += fabs(d->demo[k].row[i * wide + 1 + N + j]) < 1e-3 * rig.speed[j];
        if (rig.m->dof_frictionloss[j] > 0) most = fmax(most, count / all);
    }
    return most;
}

static void say(const demos *d)
{
    static const char *const integrators[] = {"Euler", "RK4", "implicit"};
    const int begun = rig.kept + lost();
    double seconds = 0;
    for (int k = 0; k < d->count; k++)
        seconds += d->demo[k].samples * d->dt;
    printf("%d recordings, %.3g s in all, %g s a sample: %d joints, %d motors%s; %.0f s\n", d->count, seconds, d->dt, d->N,
           rig.m->nu, d->forces ? ", forces on the joints as tau" : "", now() - rig.began);
    printf("%s with %d steps of %g s a sample: half the step changes the motion by %.2g %%\n", integrators[rig.m->opt.integrator],
           rig.steps, rig.m->opt.timestep, 100 * rig.step_error);
    for (int i = 0; i < LOSSES; i++)
        if (rig.lost[i]) printf("%d of %d %s and are left out\n", rig.lost[i], begun, losses[i]);
    if (next_path) printf("next=: %d of those that were chosen could not be recorded\n", rig.unwilling);
    if (rig.stops) printf("%d end at a limit of a joint or tendon\n", rig.stops);
    if (rig.contacts) printf("%d end at a contact: contact is outside the class of models\n", rig.contacts);
    if (rig.untouched) printf("without contacts: the model is of the machine that touches nothing\n");
    if (rig.taut) printf("%d tendons are taut at rest: the model is of the machine with taut tendons\n", rig.taut);
    if (drags())
        printf("drag grows with the square of the speed (density %g): ROLN_DAMPING 2\n", rig.m->opt.density);
    if (stands(d) > 0.05)
        printf("dry friction holds a joint in %.0f %% of the samples: ROLN_STICTION\n", 100 * stands(d));
    if (rig.turns) printf("joints turn round in %d: without autoencoder as angles, with one as numbers that grow\n", rig.turns);
    if (rig.servos) printf("%d motors are servos or have dynamics: recorded is the force that they exert\n", rig.servos);
    say_joints(d);
}

static void give_up(void)
{
    fail("of %d recordings %d %s (%s), %d %s, %d %s, %d %s; the last stop was %s\nhint: unstable: damping or softer springs; "
         "limits: wider ranges or speed=0.5; motionless: effort=4, less dry friction or motors",
         rig.kept + lost(), rig.lost[0], losses[0], *rig.why ? rig.why : "-", rig.lost[1], losses[1], rig.lost[2], losses[2],
         rig.lost[3], losses[3], *rig.where ? rig.where : "nothing");
}

/* Most recordings are lost: one change. */
static void change(void)
{
    int most = 0;
    for (int i = 0; i < LOSSES; i++)
        if (rig.lost[i] > rig.lost[most]) most = i;
    printf("%d of %d %s", rig.lost[most], rig.kept + lost(), losses[most]);
    if (most == UNSTABLE) printf(" (%s)", rig.why);
    else if (most != STILL) printf(" (%s)", rig.where);
    if (most == TOUCHED && !rig.untouched) {
        rig.untouched = 1, rig.m->opt.disableflags |= mjDSBL_CONTACT;
        printf("; again without contacts\n");
    } else if (most == STILL && rig.m->nu > 0 && settings[EFFORT].value < 30) {
        settings[EFFORT].value *= 2;
        for (int a = 0; a < rig.m->nu; a++)
            rig.pull[a] = strongest(a) > 0 ? fmin(2 * rig.pull[a], strongest(a)) : 2 * rig.pull[a];
        printf("; again with twice the effort\n");
    } else if (most == STOPPED && rig.spread < 0.3 && rig.least > SHORTEST) {
        rig.least = rig.least / 4 > SHORTEST ? rig.least / 4 : SHORTEST;
        printf("; again, with recordings of %g s or more\n", rig.least * rig.dt);
    } else if (most != STILL && rig.spread > 0.1) {
        rig.spread /= 2, printf("; again with amplitudes of %g\n", rig.spread);
    } else {
        printf("\n");
        give_up();
    }
    fflush(stdout);
}

/* Everything that is recorded, by the gentlest means that it takes. */
static demos all_recordings(void)
{
    demos d, next = {.N = rig.m->nv};
    rig.spread = 1;
    measure_all();
    if (next_path && (rig.m->neq > 0 || rig.taut > 0))
        fail("next=: a start would break the equalities or strings of this machine\nhint: more recordings: train=");
    if (next_path && demos_read_csv(&next, next_path)) exit(1);
    if (next.forces > 0 && next.forces != rig.columns)
        fail("next=%s: no recordings of this machine\nhint: OUT_next.csv of the trainer, of a model of all joints", next_path);
    for (int k = 0; k < next.count; k++)
        if (next.demo[k].samples > 1 && fabs(next.demo[k].row[demos_wide(&next)] - rig.dt) > 1e-6 * rig.dt)
            fail("next=%s: samples of %g s, here %g s\nhint: dt=", next_path, next.demo[k].row[demos_wide(&next)], rig.dt);
    if (settings[TRAIN].value == 0) settings[TRAIN].value = fmin(30 + 5 * rig.m->nv, 100);
    const size_t most = (size_t)(rig.m->nv > rig.m->nu ? rig.m->nv : rig.m->nu), terms = TERMS * most;
    double *x = room((3 * terms + 2 * most) * sizeof *x);
    drive v = {0, NULL, 0, 0, x, x + terms, x + 2 * terms, x + 3 * terms, x + 3 * terms + most};
    rig.least = (int)fmax(SHORTEST, settings[SECONDS].value / rig.dt / 4);
    printf("  steps of a sample: trying\n");
    fflush(stdout);
    choose_steps(&v);
    while (record_all(&d, &v, &next))
        demos_free(&d), change();
    for (int j = 0; j < rig.m->nv && rig.turns > 0; j++)
        rig.angle[j] |= circles(j);
    free(x), demos_free(&next);
    return d;
}

int main(int argc, char **argv)
{
    static const char *const ends[] = {".csv", "_test.csv", ".h5", ".h", "_full.h", "_constant.csv", "_angles.h"};
    char out[4096], full[4200], path[7][4200], model[4096];
    const char *name;
    if (argc >= 3 && strcmp(argv[1], "--name") == 0) {
        if (argc > 3 && !realpath(argv[3], model)) snprintf(model, sizeof model, "%s", argv[3]);
        map_out(argv[2], argc > 3 ? model : NULL, out);
        puts(out);
        return 0;
    }
    if (argc < 3)
        fail("usage: record MODEL.xml OUT [seed=1] [train=N] [test=10] [seconds=2] [dt=S] [speed=1] [effort=1] [next=FILE], or "
             "record --name OUT [MODEL.xml] for the name of OUT in C");
    rig.began = rig.told = now();
    read_settings(argc, argv);
    map_out(argv[2], NULL, out);
    name = strrchr(out, '/') ? strrchr(out, '/') + 1 : out;
    if (strcmp(out, argv[2]) != 0) printf("  %s is written as %s, since configs are named after it\n", argv[2], out);
    snprintf(full, sizeof full, "%s_full", name);
    for (int i = 0; i < 7; i++)
        snprintf(path[i], sizeof path[i], "%s%s", out, ends[i]);
    load(argv[1]);
    if (!realpath(argv[1], model)) fail("cannot read %s: %s\nhint: check the path", argv[1], strerror(errno));
    demos d = all_recordings();
    const shape s = propose(&d);
    write_config(name, path[3], model, &s, OWN);
    write_config(full, path[4], model, &s, FULL);
    if (more_angles(&s)) write_config(name, path[6], model, &s, ANGLES);
    else remove(path[6]);
    write_constant(&d, path[5]);
    if (demos_write_csv(&d, 0, path[0]) || demos_write_csv(&d, 1, path[1])) return 1;
    if (demos_write_h5(&d, argv[1], path[2])) refuse_place(path[2]);
    say(&d);
    demos_free(&d);
    return 0;
}
