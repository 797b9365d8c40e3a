/* SPDX-License-Identifier: MIT */
/* baseline.h - the regression of regression.h beside a training with torque=1 of a model whose coordinates are the joints.

   train.c includes it behind its settings, its state and report.h. The regression is fitted to the training recordings, in
   seconds, and tells what they tell of each torque. Its errors on held-out recordings stand below the table of errors: what a model
   without networks reaches. The networks begin there (start.h) unless start=random, from= or the config say otherwise. */

#ifndef BASELINE_H
#define BASELINE_H

#include "start.h"

static regression baseline;
static int fitted; /* 1: baseline is a regression of these recordings */
static struct {
    double ms;
    regression_error e;
} baseline_ahead[2]; /* its errors on held-out recordings, for page.h; ms 0: none */

static void baseline_sample(void *ctx, int i, double *q, double *qd, double *qdd, double *tau)
{
    const motion *m = ctx;
    int j;
    for (j = 0; j < m->N; j++) {
        const int at = i * m->N + j;
        q[j] = (double)m->q[at], qd[j] = (double)m->qd[at], qdd[j] = (double)m->qdd[at], tau[j] = (double)m->tau_mid[at];
    }
}

/* Recordings from .. to - 1 of m. */
static regression_source source_of(motion *m, int from, int to)
{
    const regression_source x = {to - from, m->first + from, m->dt, baseline_sample, m};
    return x;
}

/* named[j] = 1 of the joints of a list, 1,3. */
static void read_joints(int word, char *named)
{
    const char *text = words[word].value;
    memset(named, 0, M(N));
    while (text && *text) {
        char *end;
        const long k = strtol(text, &end, 10);
        if (end == text || k < 1 || k > (int)M(N) || (*end && *end != ','))
            fail("%s=%s: expected numbers of joints\nhint: 1 .. %d, apart by commas", words[word].key, words[word].value,
                 (int)M(N));
        named[k - 1] = 1, text = end + (*end == ',');
    }
}

/* A full turn of each joint; 0 of those that sliders= names. */
static void read_turns(double *turn)
{
    char slider[M(N)];
    int j;
    read_joints(SLIDERS, slider);
    for (j = 0; j < (int)M(N); j++)
        turn[j] = slider[j] ? 0 : 2 * acos(-1.0);
}

static int ignores_found(void)
{
    return strcmp(words[IGNORE].value, "auto") == 0;
}

/* Nonzero if networks are to begin at the regression. */
static int starts_there(void)
{
    const char *const start = words[BEGIN].value;
    return strcmp(start, "regression") == 0 ||
           (strcmp(start, "auto") == 0 && start_possible() && set("torque") > 0 && !words[FROM].value);
}

static void check_start(void)
{
    double turn[M(N)];
    char named[M(N)];
    read_turns(turn);
    if (!ignores_found() && strcmp(words[IGNORE].value, "none") != 0) {
        read_joints(IGNORE, named);
        if ((int)M(n) != (int)M(N) || (int)M(inputs) > 0)
            fail("ignore=%s is for models whose coordinates are the joints\nhint: leave it out", words[IGNORE].value);
    }
    if (!starts_there() && strcmp(words[BEGIN].value, "random") != 0 && strcmp(words[BEGIN].value, "auto") != 0)
        fail("start=%s: expected auto, random or regression\nhint: leave start= out for auto", words[BEGIN].value);
    if (!starts_there()) return;
    if (!(set("torque") > 0)) fail("start=regression is one of torques\nhint: torque=1");
    if (words[FROM].value) fail("start=regression and from=: networks begin at one of them\nhint: leave one of them out");
    if (!start_possible())
        fail("start=regression is for models whose coordinates are the joints, without ROLN_INPUTS, ROLN_ACTUATOR, ROLN_DRIVEN, "
             "SPD layers and a learned base point\nhint: leave start= out");
}

/* Fits it to what is trained with, and prints it. With seconds= below 100 it is smaller, and of fewer samples. */
static void fit_baseline(void)
{
    const double part = set("seconds") > 0 ? fmin(1, set("seconds") / 100) : 1, from = now();
    const regression_source x = source_of(&d, 0, train);
    double turn[M(N)];
    regression_status st;
    read_turns(turn);
    if (!JOINTS || !(set("torque") > 0) || (int)M(N) > (int)REGRESSION_JOINTS) return;
    baseline = regression_new(M(N), turn), baseline.unit = torque_scale;
    baseline.work *= part, baseline.most = (int)(baseline.most * fmin(1, cbrt(2 * part)));
    st = regression_fit(&baseline, &x);
    fitted = st == REGRESSION_OK;
    if (fitted) regression_tell(&baseline, stdout), printf("regression: %.1f s\n", now() - from);
    else printf("no regression: %s\n", regression_status_text(st));
    fflush(stdout);
}

/* 1 of a joint that moves, and on which M and V of the regression do not depend. */
static char ignorable(int j)
{
    return fitted && (baseline.shape.unused & ~baseline.still) >> j & 1;
}

/* Coordinates become ignorable: those of ignore=, or those that the regression has left out if the networks begin there. */
static void leave_out(void)
{
    char named[M(N)] = {0};
    int j;
    if (!ignores_found() && strcmp(words[IGNORE].value, "none") != 0) read_joints(IGNORE, named);
    for (j = 0; j < (int)M(N) && ignores_found() && starts_there(); j++)
        named[j] = ignorable(j);
    for (j = 0; j < (int)M(N); j++)
        if (named[j]) (void)M(ignore)(&s.p, j);
    for (j = 0; j < (int)M(N) && JOINTS; j++)
        if (M(ignores)(&s.p, j)) printf("joint %d: left out of M and V of the model\n", j + 1);
        else if (ignores_found() && ignorable(j))
            printf("hint: ignore=%d leaves joint %d out of M and V of the model\n", j + 1, j + 1);
}

/* Its errors after so many samples, in at most 40,000 steps. */
static regression_error baseline_errors(motion *m, int from, int to, int samples)
{
    enum { STEPS = 40000 };
    const regression_source held = source_of(m, from, to);
    const double cost = (double)samples * regression_substeps(&baseline, m->dt) * (m->first[to] - m->first[from]);
    const int every = (int)fmin(fmax(stride_of(m, 0.025), cost / STEPS), m->samples);
    double mean[M(N)], unit[M(N)];
    int j;
    for (j = 0; j < (int)M(N); j++)
        mean[j] = (double)s.qbar[j], unit[j] = units_of(&s.p) ? (double)units_of(&s.p)[j] : 1;
    return regression_errors(&baseline, &held, samples, every, mean, unit);
}

/* Its line below the table: errors of torques, and E_q after 100 ms and 1 s. */
static void tell_baseline(void)
{
    static const double ahead[] = {0.1, 1};
    int k;
    if (!fitted) return;
    for (k = 0; k < 2 && !halted; k++) {
        const int samples = (int)fmin(fmax(1, floor(ahead[k] / d.dt + 0.5)), d.samples);
        const regression_error e = baseline_errors(&d, train, d.trajectories, samples);
        baseline_ahead[k].ms = 1e3 * samples * d.dt, baseline_ahead[k].e = e;
        if (k == 0) printf("regression on the same recordings: torques off by %s %% in all", in_percent(e.all).text);
        if (e.windows > e.failed) printf(", E_q %s %% after %.4g ms", in_percent(e.q).text, 1e3 * samples * d.dt);
        if (e.failed > 0) printf(" (%d of %d windows failed)", e.failed, e.windows);
    }
    if (k > 0) printf("\n");
    fflush(stdout);
}

/* Nonzero if noise of the torques, and not the model, is why E_q is more than half of the error of q + h qd: as far ahead as look=
   the regression is twice as good as q + h qd, so the torques are those of the motion; here it is not, and it is not better than
   the model, which is better than q + h qd. Noise of a torque is forgotten in the long run, a wrong model is not. */
static int limited_by_torques(const judged *of, int samples, const error *e)
{
    motion *const m = of->m == &d ? &d : &unseen;
    regression_error far, here;
    if (!fitted || halted || !(e->q < e->constant) || samples * m->dt >= s.ahead) return 0;
    here = baseline_errors(m, of->from, of->to, samples);
    if (here.failed > 0 || !(e->q / e->constant <= 1.1 * here.q / here.constant)) return 0;
    far = baseline_errors(m, of->from, of->to, (int)(s.ahead / m->dt + 0.5));
    return 20 * far.failed <= far.windows && BETTER * far.q <= far.constant;
}

/* Torques that the regression leaves, over the rms torque: the rms over joints, of training samples. */
static double baseline_noise(void)
{
    double sum = 0;
    int joints = 0, j;
    for (j = 0; j < baseline.joints; j++)
        if (baseline.torque[j] > 0) sum += pow(baseline.noise[j] / baseline.torque[j], 2), joints++;
    return joints > 0 ? sqrt(sum / joints) : 0;
}

/* The networks begin at the regression, if there is one. */
static void start_at_baseline(void)
{
    const regression_source x = source_of(&d, 0, train);
    if (!fitted || !starts_there()) return;
    s.begun_there = start_networks(&baseline, &x, &s.p);
}

#endif
