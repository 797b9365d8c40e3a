/* SPDX-License-Identifier: MIT */
/* regress.c - what recordings tell of a machine's torques, in seconds and without a config.

   cc -std=c99 -O3 -march=native -I. -Iexamples examples/regress.c -o regress -lm
   ./regress motion.csv JOINTS [held=0.1] [sliders=2,5] [degrees=1]

   motion.csv is read as train.c reads it (recording.h), with the columns t, q.., qd.., tau... Joints are hinges in radians. Set
   degrees=1 if they are in degrees. `sliders` names the others, counted from 1. The last recordings, a part `held` of them, are
   held out. Printed: a Lagrangian regression of the others (regression.h), joint by joint, and its errors on the held-out ones.
   Run it before train.c: if these torques are wrong, the units, signs, filters or columns are. Exit code 0: done; 1: said in
   the last lines. */
#define NO_THREADS /* no clock but that of C */
#include "recording.h"
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
    if (*end == text || x < 1 || x > most) fail("%s: expected a number from 1 to %d", text, most);
    return (int)x;
}

int main(int argc, char **argv)
{
    wanted w = {"regress", 0, 0, 1, 0, 0, 0, 1};
    double turn[REGRESSION_JOINTS], part = 0.1;
    char *end;
    motion d;
    regression r;
    regression_source source;
    regression_status st;
    int train, i, j;
    if (argc < 3) fail("usage: regress motion.csv JOINTS [held=0.1] [sliders=2,5] [degrees=1]");
    w.N = number_at(argv[2], REGRESSION_JOINTS, &end);
    for (j = 0; j < w.N; j++)
        turn[j] = 2 * acos(-1.0);
    for (i = 3; i < argc; i++)
        if (strncmp(argv[i], "held=", 5) == 0) {
            part = strtod(argv[i] + 5, &end);
            if (end == argv[i] + 5 || *end || !(part > 0 && part < 1)) fail("%s: expected a number between 0 and 1", argv[i]);
        } else if (strcmp(argv[i], "degrees=1") == 0) {
            for (j = 0; j < w.N; j++)
                turn[j] = turn[j] > 0 ? 360 : 0;
        } else if (strncmp(argv[i], "sliders=", 8) == 0) {
            for (end = argv[i] + 7; *end == '=' || *end == ',';)
                turn[number_at(end + 1, w.N, &end) - 1] = 0;
        } else fail("%s: expected held=, sliders= or degrees=1", argv[i]);
    d = read_recording(argv[1], &w);
    (void)add_noise, (void)smooth; /* are the trainer's */
    train = d.trajectories - (int)ceil(d.trajectories * part);
    if (train < 1) fail("%s: one recording alone: nothing can be held out\nhint: part it by blank lines", argv[1]);
    printf("%d recordings (%d held out), %d samples of %g s, %d joints\n", d.trajectories, d.trajectories - train, d.samples, d.dt,
           d.N);
    source = (regression_source){train, d.first, d.dt, sample, &d};
    r = regression_new(d.N, turn);
    st = regression_fit(&r, &source);
    if (st != REGRESSION_OK) fail("%s: %s", argv[1], regression_status_text(st));
    regression_tell(&r, stdout);
    tell_errors(&r, &d, train);
    regression_free(&r);
    return DONE;
}
