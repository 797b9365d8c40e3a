/* SPDX-License-Identifier: MIT */
/* regression.c - examples/regression.h on simulated machines whose torques are known exactly.

   The truth is the principle of virtual work, written from positions and their second derivatives: it has no mass matrix and no
   Christoffel symbols. Machines: planar arms of 2 and 3 links, the same arm with joints counted from the tip, an arm on a vertical
   column, a cart with a pendulum and a spring. Prints the number of checks, last line: N passed, N failed. */
#include "regression.h"

enum { MOST = 4 };

typedef enum { PLANAR, REVERSED, COLUMN, CART } kind;

/* A machine, its recordings, and what is done to them. */
typedef struct {
    kind what;
    int joints, count, first[32];
    double dt, noise, dry;
    double turn[MOST], unit[MOST], torque; /* full turn and unit of q, of a rad or m; unit of tau, of a Nm or N */
    double still[MOST], silent[MOST];      /* 1: joint does not move; its torque is replaced by a constant, 1 + that */
    double wild;                           /* added to one torque */
} machine;

static int passed, failed;

static void check(int good, const char *what, double value, double bound)
{
    passed += good, failed += !good;
    if (!good) printf("regression.c: %s: %g, expected %g\n", what, value, bound);
}

static void below(double value, double bound, const char *what)
{
    check(value <= bound, what, value, bound);
}

static void is(double value, double expected, const char *what)
{
    check(value == expected, what, value, expected);
}

/* Virtual work of links in a vertical plane, angles of joints relative; on a column, q0 turns the plane. tau [joints]. */
static void truth_arm(int column, int links, const double *q, const double *qd, const double *qdd, double *tau)
{
    static const double length[] = {0.5, 0.4, 0.3}, mass[] = {2, 1.5, 0.8}, inertia[] = {0.05, 0.03, 0.01},
                        rotor[] = {0.1, 0.06, 0.02};
    const double g = 9.81, *a = q + column, *ad = qd + column, *add = qdd + column;
    double x = 0.1 * column, xd = 0, xdd = 0, z = 0, zdd = 0, at = 0, w = 0, wd = 0;
    double dx[MOST] = {0}, dz[MOST] = {0};
    int i, k;
    for (i = 0; i < links + column; i++)
        tau[i] = 0;
    if (column) tau[0] = 0.2 * qdd[0];
    for (k = 0; k < links; k++) {
        const double l = length[k], m = mass[k];
        double fx, fz;
        at += a[k], w += ad[k], wd += add[k];
        x += l * cos(at), xd -= l * sin(at) * w, xdd -= l * (cos(at) * w * w + sin(at) * wd);
        z += l * sin(at), zdd += l * (cos(at) * wd - sin(at) * w * w);
        for (i = 0; i <= k; i++)
            dx[i] -= l * sin(at), dz[i] += l * cos(at);
        fx = m * (xdd - (column ? x * qd[0] * qd[0] : 0)), fz = m * (zdd + g);
        for (i = 0; i <= k; i++)
            tau[column + i] += fx * dx[i] + fz * dz[i] + inertia[k] * wd;
        if (column) tau[0] += m * x * (x * qdd[0] + 2 * xd * qd[0]);
        tau[column + k] += rotor[k] * add[k];
    }
}

static void truth_cart(const double *q, const double *qd, const double *qdd, double *tau)
{
    const double m = 0.5, M = 1.5, l = 0.6, g = 9.81, spring = 20;
    tau[0] = (M + m) * qdd[0] + m * l * (cos(q[1]) * qdd[1] - sin(q[1]) * qd[1] * qd[1]) + spring * q[0];
    tau[1] = m * l * l * qdd[1] + m * l * cos(q[1]) * qdd[0] + m * g * l * sin(q[1]);
}

/* tau of a motion in rad, m, Nm, N. */
static void truth(const machine *m, const double *q, const double *qd, const double *qdd, double *tau)
{
    const int N = m->joints;
    int j;
    if (m->what == REVERSED) {
        double r[3][MOST] = {{0}}, t[MOST];
        for (j = 0; j < N; j++)
            r[0][j] = q[N - 1 - j], r[1][j] = qd[N - 1 - j], r[2][j] = qdd[N - 1 - j];
        truth_arm(0, N, r[0], r[1], r[2], t);
        for (j = 0; j < N; j++)
            tau[j] = t[N - 1 - j];
    } else if (m->what == CART) truth_cart(q, qd, qdd, tau);
    else truth_arm(m->what == COLUMN, N - (m->what == COLUMN), q, qd, qdd, tau);
    for (j = 0; j < N; j++)
        tau[j] += 0.3 * qd[j] + 0.05 * (j + 1) + m->dry * tanh(qd[j] / 0.05);
}

/* Sums of sines of other phases in each recording: sample i, in rad, m. */
static void motion(const machine *m, int i, double *q, double *qd, double *qdd)
{
    int run = 0, j, k;
    while (m->first[run + 1] <= i)
        run++;
    for (j = 0; j < m->joints; j++) {
        const double size = m->what == CART && j == 0 ? 0.1 : 0.9;
        q[j] = 0.2 * j - 0.3, qd[j] = qdd[j] = 0;
        for (k = 1; k <= 3 && !m->still[j]; k++) {
            const double w = 1.3 * k + 0.37 * j + 0.1 * run, phase = 2.1 * k * (run + 1) + 1.7 * j * k,
                         a = size * (k == 1 ? 1.4 : 0.7 / k);
            const double t = m->dt * (i - m->first[run]);
            q[j] += a * sin(w * t + phase), qd[j] += a * w * cos(w * t + phase), qdd[j] -= a * w * w * sin(w * t + phase);
        }
    }
}

static double noise_of(unsigned *seed)
{
    double sum = -6;
    int k;
    for (k = 0; k < 12; k++)
        sum += regression_random(seed);
    return sum;
}

static void sample(void *ctx, int i, double *q, double *qd, double *qdd, double *tau)
{
    const machine *m = ctx;
    unsigned seed = (unsigned)i * 2654435761u;
    int j;
    motion(m, i, q, qd, qdd), truth(m, q, qd, qdd, tau);
    for (j = 0; j < m->joints; j++) {
        tau[j] = m->silent[j] > 0 ? m->silent[j] - 1 : tau[j] + m->noise * noise_of(&seed);
        tau[j] *= m->torque / m->unit[j];
        q[j] *= m->unit[j], qd[j] *= m->unit[j], qdd[j] *= m->unit[j];
    }
    if (i == 100) tau[0] += m->wild;
}

static machine machine_of(kind what, int joints, int runs, int samples)
{
    machine m;
    int j;
    memset(&m, 0, sizeof m);
    m.what = what, m.joints = joints, m.dt = 0.01, m.torque = 1, m.count = runs;
    for (j = 0; j < joints; j++)
        m.unit[j] = 1, m.turn[j] = what == CART && j == 0 ? 0 : 2 * acos(-1.0);
    for (j = 0; j <= runs; j++)
        m.first[j] = j * samples;
    return m;
}

static regression_source source_of(machine *m)
{
    const regression_source s = {m->count, m->first, m->dt, sample, m};
    return s;
}

/* Largest error of the torque at fresh motion of the same range, and of M against tau(q, 0, e_j) - tau(q, 0, 0); each over the rms
   or the inertia of its joints. */
static void compare(const machine *m, const regression *r, double *off, double *off_M)
{
    const int N = m->joints;
    regression_work w = regression_work_new(r);
    double q[MOST], qd[MOST], qdd[MOST], a[MOST], b[MOST], M[MOST * MOST], c[3][MOST], rest[MOST] = {0};
    int i, j, k;
    *off = *off_M = 0;
    for (i = 5; i < m->first[m->count] - 5; i += 7) {
        motion(m, i, q, qd, qdd);
        for (j = 0; j < N; j++)
            qd[j] *= -1, qdd[j] = 0.7 * qdd[j] + 1;
        truth(m, q, qd, qdd, a), regression_torque(r, q, qd, qdd, b, &w);
        for (j = 0; j < N; j++)
            *off = fmax(*off, fabs(a[j] - b[j]) / r->torque[j]);
        (void)regression_terms(r, q, rest, M, c[0], c[1], c[2], &w);
        truth(m, q, rest, rest, a);
        for (k = 0; k < N; k++) {
            double e[MOST] = {0};
            e[k] = 1, truth(m, q, rest, e, b);
            for (j = 0; j < N; j++)
                *off_M = fmax(*off_M, fabs(M[j * N + k] - b[j] + a[j]) / sqrt(r->inertia[j] * r->inertia[k]));
        }
    }
    regression_work_free(&w);
}

/* Without noise: torques, M, structure, positive definite everywhere, a roll-out. */
static void test_exact(kind what, int joints, int chain, unsigned unused)
{
    machine m = machine_of(what, joints, 8, 300);
    regression_source s = source_of(&m);
    regression r = regression_new(joints, m.turn);
    double off, off_M, mean[MOST] = {0};
    regression_error e;
    is(regression_fit(&r, &s), REGRESSION_OK, "status");
    compare(&m, &r, &off, &off_M);
    below(off, 1e-6, "torque without noise"), below(off_M, 1e-5, "M without noise");
    is(r.shape.chain != 0, chain, "chain order"), is(r.shape.unused, unused, "joints on which nothing depends");
    is(r.indefinite, 0, "places with M that is not positive definite");
    e = regression_errors(&r, &s, 50, 40, mean, NULL);
    below(e.all, 1e-6, "torque error of recordings"), below(e.q, 1e-3, "roll-out of half a second"),
        is(e.failed, 0, "failed roll-outs");
    regression_free(&r);
}

/* The same errors in mNm, kNm, degrees; with noise, so that there are errors. */
static void test_units(void)
{
    static const double torque[] = {1, 1e-6, 1e-3, 1e3, 1e6}, angle[] = {1, 57.295779513082323, 1, 57.295779513082323, 1e-3};
    double error[5] = {0}, ahead[5] = {0}, numbers[5] = {0};
    int k, j;
    for (k = 0; k < 5; k++) {
        machine m = machine_of(COLUMN, 3, 8, 300);
        regression_source s = source_of(&m);
        regression r;
        regression_error e;
        double mean[MOST] = {0};
        m.noise = 0.3, m.dry = 0.5, m.torque = torque[k];
        for (j = 0; j < 3; j++)
            m.unit[j] = angle[k], m.turn[j] *= angle[k];
        r = regression_new(3, m.turn);
        is(regression_fit(&r, &s), REGRESSION_OK, "status");
        e = regression_errors(&r, &s, 50, 40, mean, NULL), error[k] = e.all, ahead[k] = e.q, numbers[k] = r.numbers;
        below(e.all, 0.05, "torque with noise and dry friction"), below(e.q, 0.05, "roll-out with noise");
        is(r.indefinite, 0, "places with M that is not positive definite");
        regression_free(&r);
        below(fabs(error[k] / error[0] - 1), 1e-5, "torque error in another unit");
        below(fabs(ahead[k] / ahead[0] - 1), 1e-3, "roll-out in another unit");
        is(numbers[k], numbers[0], "numbers in another unit");
    }
}

/* A joint without motor, whose torque is 0: the same rms of its rows in kNm and in degrees as in Nm and radians. */
static void test_passive(void)
{
    double error[2] = {0};
    int k, j;
    for (k = 0; k < 2; k++) {
        machine m = machine_of(PLANAR, 2, 8, 300);
        regression_source s = source_of(&m);
        regression r;
        m.silent[1] = 1, m.noise = 0.3, m.torque = k ? 1e5 : 1;
        for (j = 0; j < 2; j++)
            m.unit[j] = k ? 57.295779513082323 : 1, m.turn[j] *= m.unit[j];
        r = regression_new(2, m.turn);
        is(regression_fit(&r, &s), REGRESSION_OK, "status");
        error[k] = r.error;
        regression_free(&r);
    }
    below(fabs(error[1] / error[0] - 1), 1e-5, "joint without motor in another unit");
}

/* With noise chain order is refused where the joints are no chain counted from the base. */
static void test_order(void)
{
    int k;
    for (k = 0; k < 2; k++) {
        machine m = machine_of(k ? REVERSED : PLANAR, 2, 8, 300);
        regression_source s = source_of(&m);
        regression r = regression_new(2, m.turn);
        m.noise = 0.5;
        is(regression_fit(&r, &s), REGRESSION_OK, "status");
        is(r.shape.chain != 0, !k, "chain order with noise");
        below(r.error_free, 0.2, "error of a small model");
        regression_free(&r);
    }
}

/* A slider in mm beside a hinge. */
static void test_slider(void)
{
    int k;
    for (k = 0; k < 2; k++) {
        machine m = machine_of(CART, 2, 8, 300);
        regression_source s = source_of(&m);
        regression r;
        regression_error e;
        double mean[MOST] = {0}, unit[MOST] = {1, 1};
        m.unit[0] = unit[0] = k ? 1000 : 1;
        r = regression_new(2, m.turn);
        is(regression_fit(&r, &s), REGRESSION_OK, "status");
        e = regression_errors(&r, &s, 50, 40, mean, unit);
        below(e.all, 1e-6, "torque of a slider"), below(e.q, 1e-3, "roll-out of a slider");
        regression_free(&r);
    }
}

/* Fits a machine. Returns the status, and the text of regression_tell. */
static regression_status told(machine *m, regression *r, char *text, size_t size)
{
    const regression_source s = source_of(m);
    regression_status st;
    FILE *f = tmpfile();
    *r = regression_new(m->joints, m->turn);
    st = regression_fit(r, &s);
    *text = 0;
    if (st != REGRESSION_OK || !f) return st;
    regression_tell(r, f), rewind(f);
    text[fread(text, 1, size - 1, f)] = 0;
    fclose(f);
    return st;
}

static void test_degenerate(void)
{
    char text[4000];
    regression r;
    machine m = machine_of(PLANAR, 3, 8, 300);
    m.still[1] = 1; /* its inertia cannot be told; the others' torques can */
    is(told(&m, &r, text, sizeof text), REGRESSION_OK, "a joint that does not move");
    is(strstr(text, "2") && strstr(text, "does not move"), 1, "and that is said");
    is(r.indefinite, 0, "M is positive definite then"), below(r.error, 1e-6, "torque error then"), regression_free(&r);
    m = machine_of(PLANAR, 3, 8, 300), m.still[0] = m.still[1] = m.still[2] = 1;
    is(told(&m, &r, text, sizeof text), REGRESSION_E_STILL, "no joint moves"), regression_free(&r);
    m = machine_of(PLANAR, 2, 1, 12);
    is(told(&m, &r, text, sizeof text), REGRESSION_E_FEW, "few samples"), regression_free(&r);
    m = machine_of(COLUMN, 4, 1, 18);
    is(told(&m, &r, text, sizeof text), REGRESSION_E_FEW, "fewer samples than numbers"), regression_free(&r);
    m = machine_of(PLANAR, 2, 8, 300), m.silent[0] = m.silent[1] = 1;
    is(told(&m, &r, text, sizeof text), REGRESSION_E_TORQUE, "torques of 0"), regression_free(&r);
    m.silent[0] = m.silent[1] = 2.5;
    is(told(&m, &r, text, sizeof text), REGRESSION_E_TORQUE, "constant torques"), regression_free(&r);
    m = machine_of(PLANAR, 2, 8, 300), m.silent[1] = 2.5;
    is(told(&m, &r, text, sizeof text), REGRESSION_OK, "one constant torque");
    is(strstr(text, "joint 2: the torque is constant") != NULL, 1, "and that is said"), regression_free(&r);
    m.silent[1] = 1;
    is(told(&m, &r, text, sizeof text), REGRESSION_OK, "one torque of 0");
    is(strstr(text, "joint 2: no torque") != NULL, 1, "and that is said"), regression_free(&r);
    m = machine_of(PLANAR, 2, 8, 300), m.wild = HUGE_VAL;
    is(told(&m, &r, text, sizeof text), REGRESSION_E_NOT_FINITE, "a torque that is infinite"), regression_free(&r);
    m = machine_of(PLANAR, 2, 1, 600);
    is(told(&m, &r, text, sizeof text), REGRESSION_OK, "one recording alone"), below(r.error, 1e-6, "its error"),
        regression_free(&r);
    m = machine_of(PLANAR, 2, 8, 300), m.noise = 30;
    is(told(&m, &r, text, sizeof text), REGRESSION_OK, "noise that hides the torque");
    is(strstr(text, "is below its noise") != NULL, 1, "and that is said"), is(r.indefinite, 0, "M is positive definite"),
        regression_free(&r);
    r = regression_new(0, m.turn);
    is(regression_fit(&r, NULL), REGRESSION_E_JOINTS, "no joints");
    r = regression_new(33, m.turn);
    is(regression_fit(&r, NULL), REGRESSION_E_JOINTS, "too many joints");
}

int main(void)
{
    int st;
    test_exact(PLANAR, 2, 1, 0);
    test_exact(PLANAR, 3, 1, 0);
    test_exact(REVERSED, 2, 0, 0);
    test_exact(COLUMN, 3, 1, 1);
    test_units();
    test_slider();
    test_passive();
    test_order();
    test_degenerate();
    for (st = REGRESSION_OK; st <= REGRESSION_E_SOLVE; st++)
        check(strlen(regression_status_text((regression_status)st)) > 0, "text of a status", st, st);
    printf("%d passed, %d failed\n", passed, failed);
    return failed > 0;
}
