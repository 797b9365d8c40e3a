/* SPDX-License-Identifier: MIT */
/* regress.c - what recordings tell of a machine's torques, in seconds and without a config.

   cc -std=c99 -O3 -march=native -I. -Iexamples examples/regress.c -o regress -lm
   ./regress motion.csv .. JOINTS [held=0.1] [sliders=2,5] [q=2:7 ..]

   motion.csv, more of them, or folders are read as train.c reads them (recording.h, files.h), with the columns t, q.., qd.., tau..,
   or those that t=, q=, qd=, tau= name; filter= and dt= are as there. Joints are hinges in radians. `sliders` names the others,
   counted from 1. What is held out held.h says. Printed: a Lagrangian regression of the others (regression.h), joint by joint, and
   its errors on the held-out ones. Run it before train.c: if these torques are wrong, the units, signs, filters or columns are.
   Exit code 0: done; 1: said in the last lines. */
#define NO_THREADS /* no clock but that of C */
#include "recording.h"
#include "files.h"
#include "held.h"
#include "regression.h"

/* Sample i of a file, for the regression. */
static void sample(void *ctx, int i, double *q, double *qd, double *qdd, double *tau)
{
    const motion *m = ctx;
    int j;
    for (j = 0; j < m->N; j++) {
        const int at = i * m->N + j;
        q[j] = (double)m->q[at], qd[j] = (double)m->qd[at], qdd[j] = (double)m->qdd[at], tau[j] = (double)m->tau_mid[at];
    }
}

/* Mean of each joint over the samples before `end`. */
static void mean_of(const motion *m, int end, double *mean)
{
    int i, j;
    for (j = 0; j < m->N; j++)
        for (mean[j] = 0, i = 0; i < end; i++)
            mean[j] += (double)m->q[i * m->N + j] / end;
}

/* Errors on held-out recordings: torques, then roll-outs of 20 ms to 1 s. */
static void tell_errors(const regression *r, motion *m, int train)
{
    static const double ahead[] = {0.02, 0.1, 0.3, 1};
    const regression_source held = {m->trajectories - train, m->first + train, m->dt, sample, m};
    double mean[REGRESSION_JOINTS];
    size_t k;
    int j;
    mean_of(m, m->first[train], mean);
    for (k = 0; k < sizeof ahead / sizeof *ahead; k++) {
        const int samples = (int)(ahead[k] / m->dt + 0.5), every = (int)(0.25 / m->dt) + 1;
        const regression_error e = regression_errors(r, &held, samples > 0 ? samples : 1, every, mean, NULL);
        for (j = 0; j < m->N && k == 0; j++)
            printf("%s%.2f", j ? " " : "held out: torque errors in % of the rms torque of each joint: ", 100 * e.tau[j]);
        if (k == 0) printf("\nheld out: torque error of all joints %.2f %%\n   ms    E_q %%   q + h qd\n", 100 * e.all);
        if (e.windows == 0) printf("%5.0f  no recording is long enough\n", 1e3 * samples * m->dt);
        else printf("%5.0f %8.3f %10.3f", 1e3 * samples * m->dt, 100 * e.q, 100 * e.constant);
        if (e.failed > 0) printf("  %d of %d roll-outs failed", e.failed, e.windows);
        printf("\n");
    }
}

/* A whole number from 1 to `most` at text; *end: what follows it. */
static int number_at(const char *text, int most, char **end)
{
    const long x = strtol(text, end, 10);
    if (*end == text || x < 1 || x > most) fail("%s: expected a number\nhint: a whole one, 1 .. %d", text, most);
    return (int)x;
}

/* Joints that are no hinges, by number, apart by commas. */
static void read_sliders(const char *text, int N, double *turn)
{
    char *end;
    for (;; text = end + 1) {
        turn[number_at(text, N, &end) - 1] = 0;
        if (*end == 0) return;
        if (*end != ',') fail("sliders=%s: expected numbers of joints\nhint: apart by commas, such as 2,5", text);
    }
}

int main(int argc, char **argv)
{
    wanted w = {.model = "regress", .torque = 1};
    const char *joints = NULL, *held = "0.1", *sliders = NULL;
    double turn[REGRESSION_JOINTS];
    file_list files = {NULL, 0};
    char *end;
    motion d;
    regression r;
    regression_source source;
    regression_status st;
    int train, i, j;
    for (i = 1; i < argc; i++) {
        char *eq = joints ? strchr(argv[i], '=') : NULL;
        if (!eq) {
            if (joints) add_files(&files, joints);
            joints = argv[i];
            continue;
        }
        *eq = 0;
        if (read_key(&w, argv[i], eq + 1)) continue;
        if (strcmp(argv[i], "held") == 0) held = eq + 1;
        else if (strcmp(argv[i], "sliders") == 0) sliders = eq + 1;
        else fail("unknown setting %s\nhint: held=, sliders=, dt=, filter=, t=, q=, qd= or tau=", argv[i]);
    }
    if (files.count == 0)
        fail("usage: regress motion.csv .. JOINTS [held=0.1] [sliders=2,5] [q=2:7 ..]\nhint: JOINTS is their number");
    w.N = number_at(joints, REGRESSION_JOINTS, &end);
    if (*end) fail("%s: expected the number of joints\nhint: it stands behind the files", joints);
    for (j = 0; j < w.N; j++)
        turn[j] = 2 * acos(-1.0);
    if (sliders) read_sliders(sliders, w.N, turn);
    d = read_recordings(files.count, files.path, &w);
    (void)add_noise, (void)smooth; /* are the trainer's */
    train = hold_out(&d, held, 1);
    if (train < 1 || train >= d.trajectories) fail("%s: nothing is left to fit, or nothing held out\nhint: held=0.1", d.path);
    printf("%d parts of the recordings (%d held out), %d samples of %g s, %d joints\n", d.trajectories, d.trajectories - train,
           d.samples, d.dt, d.N);
    source = (regression_source){train, d.first, d.dt, sample, &d};
    r = regression_new(d.N, turn);
    st = regression_fit(&r, &source);
    if (st != REGRESSION_OK) fail("%s: %s\nhint: recordings of more, and faster, motion", d.path, regression_status_text(st));
    regression_tell(&r, stdout);
    tell_errors(&r, &d, train);
    regression_free(&r);
    return DONE;
}
