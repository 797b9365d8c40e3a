/* SPDX-License-Identifier: MIT */
/* record - any machine that MuJoCo can load, moved at random and recorded: what a model is learned from.

     record MODEL.xml OUT [seed=1] [train=N] [test=10] [seconds=2] [dt=S]

   Written: OUT.csv and OUT_test.csv (columns of examples/train.c), OUT.h5 (demos.h), OUT.h, the config that is proposed,
   OUT_constant.csv, E_q of the motion carried on at constant velocity, q + h qd, on the recordings of OUT_test.csv.
   Joints are hinges and sliders. Ball and free joints are refused: their positions are quaternions, which are no q with qd = dq/dt,
   and rotation vectors, which are, jump at a half turn.

   Kinds of recordings, in turn: free falls; forces of the motors that are random sines; motors under a PD controller, with the
   machine's own M and bias, that follow random references. Servos are told random sines. Without motors: free falls only, and no
   columns tau. At the start a machine of 12 joints at most without equalities lies in a random pose, at rest; all others have swung
   from their reference pose for up to a second in a gravity that was tilted and stretched, which keeps chains closed and moves soft
   bodies as a whole.
   A recording ends where a joint or tendon reaches its limit, for a stop is an impact. Unstable ones (a warning of MuJoCo, numbers
   out of hand) are dropped and counted. If more than half are, all is repeated: with MuJoCo's own integrator in place of RK4, then
   with a half of the amplitudes, four times at most.
   tau: force of the motors on the joints, mean over the interval to the next sample, 0 of a joint without motor.
   Exit code 1: said in the last line. */
#include <ctype.h>
#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <mujoco/mujoco.h>

#include "demos.h"

#define PI 3.14159265358979323846
#define FAST 1e4 /* rad/s or m/s: a machine out of hand */
enum { SMALL = 12, TERMS = 3, TRIES = 10, LATENT = 12 };

static void fail(const char *format, ...)
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

static void *room(size_t bytes)
{
    void *p = calloc(1, bytes ? bytes : 1);
    if (!p) fail("out of memory");
    return p;
}

/* ---- settings ---- */

static struct {
    const char *key;
    double value, low, high;
} settings[] = {{"seed", 1, 0, 1e15}, {"train", 0, 0, 1e5}, {"test", 10, 1, 1e5}, {"seconds", 2, 0.1, 3600}, {"dt", 0, 0, 1}};
enum { SEED, TRAIN, TEST, SECONDS, DT, SETTINGS };

static void read_settings(int argc, char **argv)
{
    for (int i = 3; i < argc; i++) {
        int k = 0;
        char *eq = strchr(argv[i], '='), *end;
        while (k < SETTINGS && (!eq || strlen(settings[k].key) != (size_t)(eq - argv[i]) ||
                                strncmp(argv[i], settings[k].key, strlen(settings[k].key))))
            k++;
        if (k == SETTINGS) fail("%s: not one of seed=, train=, test=, seconds=, dt=", argv[i]);
        const double x = strtod(eq + 1, &end);
        if (end == eq + 1 || *end || !(x >= settings[k].low && x <= settings[k].high))
            fail("%s: a number, %g .. %g", argv[i], settings[k].low, settings[k].high);
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

static struct {
    mjModel *m;
    mjData *d;
    int stride, own, columns; /* steps of a sample; the integrator of the model; columns tau */
    int servos;               /* motors that are more than a force times a gear */
    double spread;            /* of amplitudes, at first 1 */
    double *force;            /* [nv] a force that moves a joint well */
    double *moment;           /* [nu][nv] B^T of the motors, in the pose that the model begins in */
    double *want;             /* [2 nv] the controller's */
    double *pull;             /* [nu] a motor's force that does */
    char why[300];            /* the last one was unstable */
    int turned, stopped, touched;                      /* of one recording: does it turn round, end at a limit, have contacts? */
    int turns, stops, contacts, kept, shorts, unstable; /* how many of those kept; and of those that are left out */
} rig;

static void on_error(const char *message) { fail("MuJoCo: %s", message); }
static void on_warning(const char *message) { (void)message; /* counted in d->warning */ }

static const char *joint_name(int j)
{
    const char *name = mj_id2name(rig.m, mjOBJ_JOINT, j);
    return name ? name : "";
}

static void load(const char *path)
{
    char error[1000] = "";
    mju_user_error = on_error;
    mju_user_warning = on_warning;
    FILE *f = fopen(path, "r");
    if (!f) fail("cannot read %s", path);
    fclose(f);
    rig.m = mj_loadXML(path, NULL, error, sizeof error);
    for (char *c = error; *c; c++)
        if (*c == '\n') *c = ' ';
    if (!rig.m) fail("%s: %s", path, error);
    const mjModel *m = rig.m;
    for (int j = 0; j < m->njnt; j++) {
        const int ball = m->jnt_type[j] == mjJNT_BALL;
        if (ball || m->jnt_type[j] == mjJNT_FREE)
            fail("%s: joint %d %s is %s: its quaternion is no q with qd = dq/dt; three hinges%s in its place", path, j + 1,
                 joint_name(j), ball ? "a ball joint" : "free", ball ? "" : " and three sliders");
    }
    if (m->nv == 0) fail("%s: there are no joints", path);
    if (m->nv > 1000) fail("%s: %d joints: 1000 at most", path, m->nv);
    rig.own = m->opt.integrator;
    rig.m->opt.jacobian = mjJAC_DENSE;
    rig.d = mj_makeData(m);
    if (!rig.d) fail("out of memory");
}

/* A motor whose force is its command times a gain. */
static int plain(int a)
{
    const mjModel *m = rig.m;
    return m->actuator_gaintype[a] == mjGAIN_FIXED && m->actuator_gainprm[a * mjNGAIN] != 0
        && m->actuator_biastype[a] == mjBIAS_NONE && m->actuator_dyntype[a] == mjDYN_NONE;
}

static int limited(int j) { return rig.m->jnt_limited[j]; }
static int hinge(int j) { return rig.m->jnt_type[j] == mjJNT_HINGE; }

/* A hinge that may turn round. */
static int circles(int j) { return hinge(j) && !limited(j) && rig.m->jnt_stiffness[j] <= 0; }

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

static double pose(int j, uint64_t *state) { return middle(j) + 0.8 * rig.spread * reach(j) * uniform(state, -1, 1); }

/* Forces that move the machine well: half of what gravity does at twenty poses, and an acceleration of 15 reaches a second^2. */
static void measure(void)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    uint64_t state = 7;
    double *M = room((size_t)(m->nv * m->nv) * sizeof *M);
    rig.force = room((size_t)m->nv * sizeof(double)), rig.want = room((size_t)(2 * m->nv) * sizeof(double));
    rig.pull = room((size_t)m->nu * sizeof(double)), rig.moment = room((size_t)(m->nu * m->nv) * sizeof(double));
    mj_resetData(m, d);
    for (int k = 0; k <= 20; k++) {
        for (int j = 0; j < m->nv && k < 20; j++) d->qpos[j] = pose(j, &state);
        if (k == 20) mj_resetData(m, d);
        mj_forward(m, d);
        for (int j = 0; j < m->nv; j++) rig.force[j] = fmax(rig.force[j], fabs(d->qfrc_bias[j]) / 2);
    }
    mj_fullM(m, M, d->qM);
    for (int j = 0; j < m->nv; j++) rig.force[j] += 15 * reach(j) * M[j * (m->nv + 1)];
    free(M);
    for (int a = 0; a < m->nu; a++) {
        const double *row = memcpy(rig.moment + a * m->nv, d->actuator_moment + a * m->nv, (size_t)m->nv * sizeof *row);
        double sum = 0, square = 1e-300;
        for (int j = 0; j < m->nv; j++) sum += fabs(row[j]) * rig.force[j], square += row[j] * row[j];
        rig.pull[a] = square > 1e-200 ? sum / square : 1;
        rig.servos += !plain(a);
    }
    rig.columns = m->nu > 0 ? m->nv : 0;
    const double want = settings[DT].value > 0 ? settings[DT].value : 1e-3;
    rig.stride = (int)fmax(1, floor(want / m->opt.timestep + 0.5));
}

/* ---- what moves it ---- */

enum { FALL, SINES, PD, KINDS };

typedef struct {
    int kind;
    double w, zeta; /* of the controller */
    double *size, *frequency, *phase; /* [motors or joints][TERMS] */
} drive;

static void draw_drive(drive *v, int kind, uint64_t *state)
{
    kind = kind == PD && rig.servos ? SINES : kind;
    const int n = kind == PD ? rig.m->nv : rig.m->nu;
    v->kind = kind, v->w = uniform(state, 4, 12), v->zeta = uniform(state, .6, 1);
    for (int i = 0; i < n; i++) {
        const double all = kind == PD ? 0.7 * reach(i) : rig.pull[i], own = all * rig.spread * uniform(state, .3, 1);
        for (int k = 0; k < TERMS; k++) {
            v->size[i * TERMS + k] = own * uniform(state, .5, 1) * 2 / TERMS / (k + 1);
            v->frequency[i * TERMS + k] = kind == PD ? uniform(state, .1, .8) * (k + 1) : uniform(state, .2, 2);
            v->phase[i * TERMS + k] = uniform(state, 0, 2 * PI);
        }
    }
}

/* Sum of sines i at t, and its rate. */
static double sines(const drive *v, int i, double t, double *rate)
{
    double x = 0;
    *rate = 0;
    for (int k = i * TERMS; k < (i + 1) * TERMS; k++) {
        const double w = 2 * PI * v->frequency[k];
        x += v->size[k] * sin(w * t + v->phase[k]), *rate += v->size[k] * w * cos(w * t + v->phase[k]);
    }
    return x;
}

/* rig.want = M a + bias, a the acceleration that leads joints with motors back to their references: computed torque. */
static void want(const drive *v, double t)
{
    const mjModel *m = rig.m;
    const mjData *d = rig.d;
    double *a = rig.want + m->nv;
    for (int j = 0; j < m->nv; j++) {
        double rate, x = middle(j) + sines(v, j, t, &rate);
        int moved = 0;
        for (int k = 0; k < m->nu; k++) moved |= d->actuator_moment[k * m->nv + j] != 0;
        a[j] = moved ? v->w * v->w * (x - d->qpos[j]) + 2 * v->zeta * v->w * (rate - d->qvel[j]) : 0;
    }
    mj_mulM(m, d, rig.want, a);
    mju_addTo(rig.want, d->qfrc_bias, m->nv);
}

/* What the motors are told for the next sample; d after mj_forward. Servos and the like: sines within their range. */
static void command(const drive *v, double t)
{
    const mjModel *m = rig.m;
    if (v->kind == PD) want(v, t);
    for (int a = 0; a < m->nu; a++) {
        const double *row = rig.d->actuator_moment + a * m->nv, *range = m->actuator_ctrlrange + 2 * a;
        const int ranged = m->actuator_ctrllimited[a];
        double u = 0, rate, square = 1e-300;
        if (!plain(a)) {
            if (v->kind == SINES) u = sines(v, a, t, &rate) / rig.pull[a];
            if (ranged) u = (range[0] + range[1] + (range[1] - range[0]) * u) / 2;
        } else if (v->kind == SINES) {
            u = sines(v, a, t, &rate) / m->actuator_gainprm[a * mjNGAIN];
        } else if (v->kind == PD) {
            for (int j = 0; j < m->nv; j++)
                if (row[j] != 0) u += row[j] * rig.want[j], square += row[j] * row[j];
            u /= square * m->actuator_gainprm[a * mjNGAIN];
        }
        rig.d->ctrl[a] = ranged ? fmin(fmax(u, range[0]), range[1]) : u;
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

/* Does a limit push, or a contact? */
static int acts(int limit)
{
    const mjData *d = rig.d;
    for (int i = 0; i < d->nefc; i++) {
        const int type = d->efc_type[i], is = type == mjCNSTR_LIMIT_JOINT || type == mjCNSTR_LIMIT_TENDON;
        if (limit ? is : type >= mjCNSTR_CONTACT_FRICTIONLESS && d->efc_force[i] != 0) return 1;
    }
    return 0;
}

static void start(uint64_t *state)
{
    mjModel *m = rig.m;
    mjData *d = rig.d;
    mj_resetData(m, d);
    if (m->nv <= SMALL && m->neq == 0) {
        for (int j = 0; j < m->nv; j++) d->qpos[j] = pose(j, state);
        return;
    }
    const mjOption own = m->opt;
    const double up = uniform(state, -1, 1), around = uniform(state, 0, 2 * PI), flat = sqrt(1 - up * up);
    const double size = rig.spread * (mju_norm3(own.gravity) > 0 ? mju_norm3(own.gravity) : 9.81), end = uniform(state, .2, 1);
    const double off[3] = {size * flat * cos(around), size * flat * sin(around), size * up};
    mju_addTo3(m->opt.gravity, off);
    while (d->time < end && !unstable()) mj_step(m, d);
    m->opt = own;
    d->time = 0;
}

/* Samples of a recording in row [most][wide]; -1: unstable. */
static int record(int kind, uint64_t *state, drive *v, int most, double *row)
{
    const mjModel *m = rig.m;
    mjData *d = rig.d;
    const int N = m->nv, wide = 1 + 2 * N + rig.columns;
    int k = 0;
    rig.turned = rig.stopped = rig.touched = 0;
    draw_drive(v, kind, state);
    start(state);
    mj_forward(m, d);
    for (; k < most && !rig.stopped; k++) {
        double *to = row + k * wide, *force = to + 1 + 2 * N;
        const double t = k * rig.stride * m->opt.timestep;
        to[0] = t;
        memcpy(to + 1, d->qpos, (size_t)N * sizeof *to), memcpy(to + 1 + N, d->qvel, (size_t)N * sizeof *to);
        for (int i = 0; i < rig.columns; i++) force[i] = 0;
        for (int s = 0; s < rig.stride; s++) {
            mj_forward(m, d);
            if (s == 0) command(v, t);
            mj_step(m, d);
            for (int i = 0; i < rig.columns; i++)
                force[i] += d->qfrc_actuator[i] / rig.stride;
            if (unstable()) return -1;
            rig.touched |= acts(0), rig.stopped |= acts(1);
        }
        for (int j = 0; j < N; j++) rig.turned |= circles(j) && fabs(d->qpos[j] - m->qpos0[j]) > PI;
    }
    return rig.stopped ? k - 1 : k;
}

/* All recordings; nonzero: more than half of those begun were unstable. */
static int record_all(demos *to)
{
    const mjModel *m = rig.m;
    const int train = (int)settings[TRAIN].value, count = train + (int)settings[TEST].value;
    const double dt = rig.stride * m->opt.timestep;
    const int most = (int)(settings[SECONDS].value / dt + 0.5) + 1, shortest = most / 4 > 20 ? most / 4 : 20;
    const size_t wide = (size_t)(1 + 2 * m->nv + rig.columns), terms = (size_t)(TERMS * (m->nv > m->nu ? m->nv : m->nu));
    double *row = room((size_t)most * wide * sizeof *row), *numbers = room(3 * terms * sizeof *numbers);
    drive v = {0, 0, 0, numbers, numbers + terms, numbers + 2 * terms};
    int bad = 0;
    to->N = m->nv, to->forces = rig.columns, to->inputs = 0, to->dt = dt, to->count = 0, to->demo = NULL;
    rig.stops = rig.contacts = rig.turns = rig.kept = rig.shorts = rig.unstable = 0, *rig.why = 0;
    for (int k = 0; k < count && !bad; k++)
        for (int again = 0; again < TRIES; again++) {
            uint64_t state = mix(mix((uint64_t)settings[SEED].value) + (uint64_t)(k * TRIES + again) + 1);
            const int samples = record(m->nu ? (k + again) % KINDS : FALL, &state, &v, most, row);
            rig.unstable += samples < 0, rig.shorts += samples >= 0 && samples < shortest;
            if ((bad = rig.unstable > 5 && rig.unstable > k)) break;
            if (samples < shortest) continue;
            rig.kept++, rig.turns += rig.turned, rig.stops += rig.stopped, rig.contacts += rig.touched;
            if (demos_add(to, samples, k >= train, row)) exit(1);
            break;
        }
    free(row), free(numbers);
    return bad || rig.kept < 2;
}

/* ---- the config ---- */

/* Rank of the equality constraints where d is: Gram-Schmidt with the largest row left. */
static int rank_of_equalities(void)
{
    const int N = rig.m->nv, ne = rig.d->ne;
    double *J = room((size_t)(ne * N) * sizeof *J), first = 0;
    int rank = 0;
    memcpy(J, rig.d->efc_J, (size_t)(ne * N) * sizeof *J);
    for (; rank < ne && rank < N; rank++) {
        double best = 0;
        int at = 0;
        for (int i = 0; i < ne; i++) {
            const double x = mju_dot(J + i * N, J + i * N, N);
            if (x > best) best = x, at = i;
        }
        if (rank == 0) first = best;
        if (best <= 1e-12 * first || best == 0) break;
        double *r = room((size_t)N * sizeof *r);
        mju_scl(r, J + at * N, 1 / sqrt(best), N);
        for (int i = 0; i < ne; i++) mju_addToScl(J + i * N, r, -mju_dot(J + i * N, r, N), N);
        free(r);
    }
    free(J);
    return rank;
}

/* The mean pose of the training, and with C the sum of (q - mean)(q - mean)^T of every tenth sample; returns its trace. */
static double moments(const demos *d, double *mean, double *C)
{
    const int N = d->N, wide = demos_wide(d);
    double *x = room((size_t)N * sizeof *x), trace = 0;
    int count = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s < d->demo[k].samples && !d->demo[k].test; s += 10) {
                const double *q = d->demo[k].row + s * wide + 1;
                if (pass == 0) mju_addTo(mean, q, N), count++;
                else mju_sub(x, q, mean, N);
                for (int i = 0; i < N && C && pass == 1; i++) mju_addToScl(C + i * N, x, x[i], N);
            }
        if (pass == 0) mju_scl(mean, mean, 1.0 / (count > 0 ? count : 1), N);
    }
    for (int i = 0; i < N && C; i++) trace += C[i * (N + 1)];
    free(x);
    return trace;
}

/* Hinges and sliders: each joint has a unit of its own (ROLN_SCALE each). */
static int mixed(void)
{
    int hinges = 0;
    for (int j = 0; j < rig.m->njnt; j++) hinges += hinge(j);
    return hinges > 0 && hinges < rig.m->njnt;
}

/* These units: rms over the training, 1 of joints at rest and, where a model has angles, of those; all 1 where joints are of one
   kind. */
static void units(const demos *d, const double *mean, int angles, double *unit)
{
    const int wide = demos_wide(d);
    for (int i = 0; i < d->N; i++) {
        double square = 0;
        int count = 0;
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s < d->demo[k].samples && !d->demo[k].test; s++, count++) {
                const double x = d->demo[k].row[s * wide + 1 + i] - mean[i];
                square += x * x;
            }
        unit[i] = mixed() && square > 0 && !(angles && circles(i)) ? sqrt(square / count) : 1;
    }
}

/* Coordinates with which linear POD leaves less than `leave` of the motion, at most LATENT: power iteration. */
static int principal(const demos *d, double leave)
{
    const int N = d->N;
    double *mean = room((size_t)N * sizeof *mean), *C = room((size_t)(N * N) * sizeof *C), *x = room((size_t)(2 * N) * sizeof *x);
    double all = moments(d, mean, C), left;
    int n = 0;
    if (mixed()) {
        units(d, mean, 0, x);
        all = 0;
        for (int i = 0; i < N * N; i++) C[i] /= x[i / N] * x[i % N];
        for (int i = 0; i < N; i++) all += C[i * (N + 1)];
    }
    left = all;
    for (; n < LATENT && n < N && left > leave * leave * all; n++) {
        double *y = x + N, value = 0;
        for (int i = 0; i < N; i++) x[i] = 1 + 0.1 * (i % 7);
        for (int k = 0; k < 200; k++) {
            mju_mulMatVec(y, C, x, N, N);
            value = mju_norm(y, N);
            mju_scl(x, y, 1 / (value + 1e-300), N);
        }
        for (int i = 0; i < N; i++) mju_addToScl(C + i * N, x, -value * x[i], N);
        left -= value;
    }
    free(mean), free(C), free(x);
    return n;
}

/* Monomials of n coordinates from degree 0 to d. */
static double monomials(int n, int d)
{
    double x = 1;
    for (int k = 1; k <= d; k++) x *= (double)(n + k) / k;
    return x;
}

/* Latent coordinates and the degree of the chart; n = N: no autoencoder. docs/training.md, Which config. */
typedef struct {
    int n, degree, equalities;
} shape;

static shape propose(const demos *d)
{
    const int N = d->N;
    double samples = 0;
    shape s = {N, 0, 0};
    for (int k = 0; k < d->count; k++) samples += d->demo[k].samples;
    mj_resetData(rig.m, rig.d);
    mj_forward(rig.m, rig.d);
    s.equalities = rank_of_equalities();
    if (s.equalities > 0 && s.equalities < N) s.n = N - s.equalities;
    if (s.n > 8) {
        const int n = principal(d, 0.02);
        if (n > 0 && n <= s.n / 2) s.n = n;
    }
    if (s.n == N) return s;
    s.degree = s.n <= 4 ? 4 : s.n <= 10 ? 3 : 2;
    while (s.degree > 2 && monomials(s.n, s.degree) > samples / 10) s.degree--;
    return s;
}

/* Does anything take energy away? */
static int damped(void)
{
    const mjModel *m = rig.m;
    int is = m->opt.density > 0 || m->opt.viscosity > 0 || rig.contacts > 0;
    for (int i = 0; i < m->nv; i++) is |= m->dof_damping[i] > 0;
    for (int t = 0; t < m->ntendon; t++) is |= m->tendon_damping[t] > 0 || m->tendon_frictionloss[t] > 0;
    return is;
}

static int rubbing(void)
{
    int is = 0;
    for (int i = 0; i < rig.m->nv; i++) is |= rig.m->dof_frictionloss[i] > 0;
    return is;
}

/* The config, full: of a network on all joints, without autoencoder. */
static void write_config(const char *name, const char *path, const char *model, const shape *s, int full)
{
    const mjModel *m = rig.m;
    const int n = full ? m->nv : s->n, angles = n == m->nv && rig.turns > 0;
    FILE *f = fopen(path, "w");
    if (!f) fail("cannot write %s", path);
    fprintf(f, "/* %s.h - proposed by tests/mujoco/record.c for %s: %d joints, %d motors, %d equalities; samples of %g s", name,
            model, m->nv, m->nu, s->equalities, rig.stride * m->opt.timestep);
    for (int j = 0, first = 1; j < m->njnt && rig.turns > 0; j++)
        if (circles(j)) fprintf(f, "%s%d", first ? ";\n   joints that turn round: " : ", ", j + 1), first = 0;
    if (rubbing()) fprintf(f, ";\n   dry friction");
    if (m->nu > 0 && m->nu < m->nv && m->nu * m->nv <= 40)
        for (int i = 0; i < m->nu * m->nv; i++) {
            if (i == 0) fprintf(f, ";\n   B of the motors [%d][%d] in the pose that the model begins in: ", m->nv, m->nu);
            fprintf(f, "%s%.6g", i ? ", " : "", rig.moment[i % m->nu * m->nv + i / m->nu]);
        }
    fprintf(f, " */\n#ifndef %s_h\n#define %s_h\n\n#define ROLN_NAME %s\n#define ROLN_AE %d", name, name, name, m->nv);
    if (n < m->nv) fprintf(f, ", %d\n#define ROLN_CHART polynomial, %d", n, s->degree);
    fprintf(f, "\n#define ROLN_MLP %s\n", n <= 2 ? "16, 16" : "32, 32");
    for (int j = 0; j < m->njnt && angles; j++) fprintf(f, "%s%d", j ? ", " : "#define ROLN_ANGLES ", circles(j));
    if (angles) fputc('\n', f);
    if (mixed()) fprintf(f, "#define ROLN_SCALE each\n");
    if (damped()) fprintf(f, "#define ROLN_DAMPING 1\n");
    if (rubbing()) fprintf(f, "#define ROLN_FRICTION 1\n");
    fprintf(f, "#define ROLN_HORIZON 25\n#include \"roln.h\"\n\n#endif\n");
    if (fclose(f)) fail("cannot write %s", path);
}

/* ---- q + h qd ---- */

/* q - to of joint i; of an angle that a model knows for one, the shorter way. */
static double between(int i, double q, double to)
{
    return circles(i) ? remainder(q - to, 2 * PI) : q - to;
}

/* Of those angles the mean of the training is that of their directions. */
static void mean_directions(const demos *d, double *mean)
{
    const int wide = demos_wide(d);
    for (int i = 0; i < d->N; i++) {
        double s = 0, c = 0;
        for (int k = 0; k < d->count; k++)
            for (int j = 0; j < d->demo[k].samples && !d->demo[k].test; j++) {
                const double q = d->demo[k].row[j * wide + 1 + i];
                s += sin(q), c += cos(q);
            }
        if (circles(i)) mean[i] = atan2(s, c);
    }
}

static void write_constant(const demos *d, const char *path)
{
    static const double ms[] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2995};
    const int N = d->N, wide = demos_wide(d), apart = (int)(0.025 / d->dt + 1e-6), every = apart > 1 ? apart : 1;
    double *mean = room((size_t)(2 * N) * sizeof *mean), *unit = mean + N;
    FILE *f = fopen(path, "w");
    if (!f) fail("cannot write %s", path);
    moments(d, mean, NULL);
    mean_directions(d, mean);
    units(d, mean, rig.turns > 0, unit);
    fprintf(f, "ms,E_q_percent\n");
    for (int h = 0, before = -1; h < 10; h++) {
        const int ahead = (int)(ms[h] * 1e-3 / d->dt + 0.5);
        double off = 0, var = 0;
        if (ahead == before) continue;
        before = ahead;
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s + ahead < d->demo[k].samples && d->demo[k].test; s += every) {
                const double *q = d->demo[k].row + s * wide + 1, *end = q + ahead * wide;
                for (int i = 0; i < N; i++) {
                    const double e = between(i, q[i] + ahead * d->dt * q[N + i], end[i]), v = between(i, end[i], mean[i]);
                    off += e * e / (unit[i] * unit[i]), var += v * v / (unit[i] * unit[i]);
                }
            }
        if (var > 0) fprintf(f, "%g,%.5g\n", 1e3 * ahead * d->dt, 100 * sqrt(off / var));
    }
    free(mean);
    if (fclose(f)) fail("cannot write %s", path);
}

/* ---- main ---- */

/* The file name of OUT as a name in C. */
static void name_of(const char *out, char name[100])
{
    const char *base = strrchr(out, '/') ? strrchr(out, '/') + 1 : out;
    if (!*base || strlen(base) > 80) fail("OUT %s: a file name of 1 to 80 letters at its end", out);
    for (int i = 0; (name[i] = base[i]) != 0; i++)
        if (!isalnum((unsigned char)name[i])) name[i] = '_';
    if (isdigit((unsigned char)name[0])) fail("OUT %s: the file name is to be a name in C", out);
    if (strcmp(name, base) != 0) fail("OUT %s: the file name is to be a name in C, %s", out, name);
}

static void say(const demos *d)
{
    const int begun = rig.kept + rig.shorts + rig.unstable;
    printf("%d recordings of %g s at most, %g s a sample: %d joints, %d motors%s\n", d->count, settings[SECONDS].value, d->dt, d->N,
           rig.m->nu, d->forces ? ", forces on the joints as tau" : "");
    if (rig.unstable) printf("%d of %d were unstable and are left out\n", rig.unstable, begun);
    if (rig.shorts) printf("%d of %d came to a limit at once and are left out\n", rig.shorts, begun);
    if (rig.stops) printf("%d end at a limit of a joint or tendon\n", rig.stops);
    if (rig.contacts) printf("contacts act in %d: the model takes them for smooth forces\n", rig.contacts);
    if (rig.turns) printf("joints turn round in %d: without autoencoder as angles, with one as numbers that grow\n", rig.turns);
    if (rig.servos) printf("%d motors are servos or have dynamics: recorded is the force that they exert\n", rig.servos);
}

/* Everything that is recorded, by the gentlest means that it takes. */
static demos all_recordings(void)
{
    demos d;
    rig.spread = 1;
    measure();
    if (settings[TRAIN].value == 0) settings[TRAIN].value = fmin(30 + 5 * rig.m->nv, 100);
    rig.m->opt.integrator = mjINT_RK4;
    for (int attempt = 0; record_all(&d); attempt++) {
        demos_free(&d);
        if (attempt == 5)
            fail("of %d recordings %d are unstable (%s) and %d come to a limit at once, even gently: a shorter timestep, wider "
                 "ranges?", rig.kept + rig.shorts + rig.unstable, rig.unstable, *rig.why ? rig.why : "none", rig.shorts);
        if (rig.m->opt.integrator != rig.own) rig.m->opt.integrator = rig.own, printf("unstable with RK4; again with its own\n");
        else rig.spread /= 2, printf("unstable; again with amplitudes of %g\n", rig.spread);
    }
    return d;
}

int main(int argc, char **argv)
{
    static const char *const ends[] = {".csv", "_test.csv", ".h5", ".h", "_full.h", "_constant.csv"};
    char name[100], full[120], path[6][4096];
    if (argc < 3) fail("usage: record MODEL.xml OUT [seed=1] [train=N] [test=10] [seconds=2] [dt=S]");
    read_settings(argc, argv);
    name_of(argv[2], name);
    snprintf(full, sizeof full, "%s_full", name);
    for (int i = 0; i < 6; i++)
        if (snprintf(path[i], sizeof path[i], "%s%s", argv[2], ends[i]) >= (int)sizeof path[i]) fail("OUT is too long");
    load(argv[1]);
    demos d = all_recordings();
    const shape s = propose(&d);
    write_config(name, path[3], argv[1], &s, 0);
    write_config(full, path[4], argv[1], &s, 1);
    write_constant(&d, path[5]);
    if (demos_write_csv(&d, 0, path[0]) || demos_write_csv(&d, 1, path[1])) return 1;
    if (demos_write_h5(&d, argv[1], path[2])) fail("cannot write %s", path[2]);
    say(&d);
    demos_free(&d);
    return 0;
}
