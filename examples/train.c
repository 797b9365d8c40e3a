/* SPDX-License-Identifier: MIT */
/* train.c - train a model on recorded motion.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. -Iexamples -DMODEL=pend16 examples/train.c -o train -lpthread -lm
   ./train motion.csv [key=value ...]
   ./train --help

   MODEL is the ROLN_NAME of a config header, which is named after it (pend16.h: the sizes, see roln.h). motion.csv has the columns
   t, q.., qd.., tau.. and a blank line between trajectories; recording.h reads and checks it. Without pthreads: -DNO_THREADS, as
   always on Windows; one thread then, and the same bits. Stages, each of which ends with the weights that predicted held-out
   trajectories best:

     chart     with ROLN_CHART: the encoder that a polynomial decoder undoes best, then the decoder in closed form
     layers    of an autoencoder without chart: Riemannian Adam on their reconstruction
     networks  recursive Gauss-Newton on accelerations, then also on windows of half a second, until held-out trajectories are
               predicted no better; or, method=adam, Riemannian Adam on accelerations, of all parameters together

   Written at every look at the held-out trajectories: OUT.svg, the learning curve, and OUT.check, from which resume=1 goes on, with
   the same bits as if nothing had happened. In the end: OUT_weights.h (C definition for flash), OUT.roln (packed bytes), a table of
   errors, each with its standard error over trajectories, and of the worst joint, also as OUT_errors.csv, where those of every
   joint stand, in parts of its motion and, as rms, in its unit, and OUT_motion.svg, how the median and the worst held-out
   trajectory are predicted. Keys and defaults: `settings`.

   1 settings     2 threads     3 state     4 errors     5 chart     6 Gauss-Newton     7 Adam     8 checkpoint     9 pictures
   10 stages     11 main */

#if defined _WIN32 && !defined NO_THREADS
#define NO_THREADS
#endif
#ifndef NO_THREADS
#define _POSIX_C_SOURCE 200809L
#include <pthread.h>
#endif

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) <m.h>
#define HEADER(m) HEADER_(m)
#define ROLN_ROWS 2000 /* samples of a step of Gauss-Newton */
#include HEADER(MODEL)
#include "recording.h"

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name) /* M(params) is pend16_params */

/* ---- 1 settings ---- */

static struct {
    const char *key;
    double value, low, high;
    int whole; /* a whole number */
    const char *help;
} settings[] = {
    {"seed", 1, 0, 1e15, 1, "of weights, samples and noise: trainings of one config end at different errors"},
    {"seconds", 0, 0, 1e8, 0, "end after so many at the latest; 0: no limit, and the same bits in every run"},
    {"steps", 0, 0, 1e8, 1, "end after so many steps of Gauss-Newton; 0: when held-out trajectories are predicted no better"},
    {"held", 0.1, 0, 1, 0, "part of the trajectories that is held out"},
    {"look", 1, 0, 3600, 0, "s that these are predicted ahead, to see which weights are best; at most half of the shortest one"},
    {"window", 0.5, 0, 3600, 0, "s, length of a window, at most ROLN_HORIZON steps of 20 ms or of a sample; 0: no windows"},
    {"torque", 0, 0, 1, 1, "1: use the columns tau, or u of ROLN_INPUTS; 0: no force does work"},
    {"force", 0, 0, 1e6, 0, "weight of the inverse dynamics beside accelerations: where torques work it fixes M and g themselves"},
    {"noise", 0, 0, 100, 0, "Gaussian noise added to q of motion.csv, over rms(q - mean), with ROLN_SCALE each of each joint"},
    {"smooth", 0, 0, 100000, 1, "q, qd, qdd of motion.csv from a parabola through this many samples of q on each side; 0: none"},
    {"ae", 20000, 0, 1e8, 1, "layers: updates of Adam on their reconstruction"},
    {"acc", 100000, 0, 1e8, 1, "method=adam: updates on accelerations"},
    {"lr_ae", 0.1, 0, 100, 0, "Adam: learning rate of the layers (Frobenius length of a step); less in wide ones"},
    {"lr_net", 3e-3, 0, 100, 0, "Adam: learning rate of the networks"},
    {"threads", 2, 1, 16, 1, "on which it runs; changes no bit"},
    {"resume", 0, 0, 1, 1, "1, or --resume: go on from OUT.check, if it is there"},
};
enum { SETTINGS = sizeof settings / sizeof *settings };
static struct {
    const char *key, *value, *help;
} words[] = {
    {"out", STRING(MODEL), "what the names of all files that are written begin with"},
    {"test", NULL, "a second file of recordings, for a table of errors; without qd smoothed as motion.csv is, else as it stands"},
    {"from", NULL, "packed weights to begin with"},
    {"method", "newton", "newton or adam"},
};
enum { OUT, TEST, FROM, METHOD, WORDS };

/* A training that comes to nothing. */
static void give_up(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    end_with(LOST, format, list);
    va_end(list);
}

static void help(void)
{
    int i;
    printf("train motion.csv [key=value ...]     trains " STRING(MODEL) " on recorded motion\n\n"
           "motion.csv: t in s, %d q, %d qd, %d %s (these may be left out), a blank line between trajectories\n\n",
           (int)M(N), (int)M(N), (int)M(force_size), M(inputs) > 0 ? "u" : "tau");
    for (i = 0; i < WORDS; i++)
        printf("  %s=%-*s %-15s %s\n", words[i].key, 13 - (int)strlen(words[i].key), words[i].value ? words[i].value : "", "",
               words[i].help);
    for (i = 0; i < SETTINGS; i++) {
        char range[32];
        snprintf(range, sizeof range, "%g .. %g", settings[i].low, settings[i].high);
        printf("  %s=%-*g %-15s %s\n", settings[i].key, 13 - (int)strlen(settings[i].key), settings[i].value, range,
               settings[i].help);
    }
    printf("\nWritten: OUT_weights.h, OUT.roln, OUT_errors.csv, OUT.svg (learning curve), OUT_motion.svg (median and worst\n"
           "held-out trajectory, predicted and true), OUT.check (to go on from).\n"
           "Exit: 0, weights are written, and how well they predict is said. 1 and 2, none are, and the last line says why:\n"
           "1 wrong use, recordings or files, 2 a training that came to nothing.\n");
}

static double set(const char *key)
{
    size_t i;
    for (i = 0; i < SETTINGS; i++)
        if (strcmp(settings[i].key, key) == 0) return settings[i].value;
    fail("no setting %s", key);
    return 0;
}

/* settings[k] = text, if that is a number in its range. */
static void read_setting(size_t k, const char *text)
{
    char *end;
    const double x = strtod(text, &end);
    if (end == text || *end || !isfinite(x)) fail("%s=%s: not a number", settings[k].key, text);
    if (x < settings[k].low || x > settings[k].high || (settings[k].whole && x != floor(x)))
        fail("%s=%s: %s %g .. %g", settings[k].key, text, settings[k].whole ? "a whole number," : "a number,", settings[k].low,
             settings[k].high);
    settings[k].value = x;
}

/* The arguments key=value, from the third on. */
static void read_settings(int argc, char **argv)
{
    int i;
    for (i = 2; i < argc; i++) {
        char again[] = "resume=1", *key = strcmp(argv[i], "--resume") == 0 ? again : argv[i], *eq = strchr(key, '=');
        size_t k, known = 0;
        if (!eq) fail("%s: not key=value; --help lists the keys", key);
        *eq = 0;
        for (k = 0; k < WORDS; k++)
            if (strcmp(words[k].key, key) == 0) words[k].value = eq + 1, known = 1;
        for (k = 0; k < SETTINGS; k++)
            if (strcmp(settings[k].key, key) == 0) read_setting(k, eq + 1), known = 1;
        if (!known) fail("unknown setting %s; --help lists them", key);
    }
    if (strcmp(words[METHOD].value, "newton") != 0 && strcmp(words[METHOD].value, "adam") != 0)
        fail("method=%s: newton or adam", words[METHOD].value);
    if (strlen(words[OUT].value) > 480) fail("out=%s: more than 480 letters", words[OUT].value);
}

/* ---- 2 threads ---- */

enum { THREADS = 16 };

typedef struct {
    void (*job)(void *ctx, int part, int thread);
    void *ctx;
    int parts, thread, threads;
} hand;

static void *work_off(void *arg)
{
    const hand *h = arg;
    int k;
    for (k = h->thread; k < h->parts; k += h->threads)
        h->job(h->ctx, k, h->thread);
    return NULL;
}

/* job(ctx, part, thread) for each of the parts, none of which touches what another one does. */
static void share(int parts, void (*job)(void *ctx, int part, int thread), void *ctx)
{
    hand h[THREADS] = {{NULL, NULL, 0, 0, 0}};
    const int threads = (int)set("threads");
    int t;
#ifndef NO_THREADS
    pthread_t id[THREADS];
#endif
    for (t = 0; t < threads; t++) {
        const hand own = {job, ctx, parts, t, threads};
        h[t] = own;
#ifndef NO_THREADS
        if (t > 0 && pthread_create(&id[t], NULL, work_off, &h[t]) != 0) fail("no thread");
#endif
    }
#ifdef NO_THREADS
    for (t = 0; t < threads; t++)
        work_off(&h[t]);
#else
    work_off(&h[0]);
    for (t = 1; t < threads; t++)
        pthread_join(id[t], NULL);
#endif
}

/* ---- 3 state ---- */

enum { LAYERS, NEWTON, ADAM, STAGES };
static const char *const stage_names[STAGES] = {"layers, Riemannian Adam", "networks, Gauss-Newton", "all, Riemannian Adam"};

enum {
    ROWS = sizeof((M(residuals) *)0)->r / sizeof(roln_real), /* of a step of Gauss-Newton, in parts that threads share */
    PARTS = 16, PART = ROWS / PARTS,
    WINDOWS = PART / 20, /* rows of a part that are windows, from step WINDOWS_FROM on */
    WINDOWS_FROM = 100,
    FLAT = (int)M(newton_size) == (int)M(net_size) + (int)M(input_size), /* no SPD layer nor base point: weights can be averaged */
    POINTS = 400
};
typedef char too_few_rows[WINDOWS > 0 ? 1 : -1];

/* All that a training is. */
static struct {
    int stage, step, next; /* next: step of the next look; 0: the stage has not begun */
    int best_step, since;  /* since: from where steps without a gain are counted */
    uint64_t seed;
    double seconds, best_error, ahead; /* of held-out trajectories, so many seconds ahead */
    int points;
    double point[POINTS][3];          /* learning curve: seconds, E_q near and far */
    roln_real memory, window_weight;  /* of Gauss-Newton, in steps; 0: no windows yet */
    roln_real qbar[M(N)];
    M(params) p, best;
    M(optimiser) optimiser;
    M(newton) newton;
    roln_real mean[M(newton_size)];  /* of the weights of 8 steps */
} s;

static motion d;  /* of motion.csv */
static int train; /* its first trajectories; the others are held out */
static double began;
static M(train) work[THREADS];
static M(residuals) residuals;

static double seconds(void)
{
    return s.seconds + now() - began;
}

/* First samples of all windows of trajectories a .. b-1 that reach `reach` samples on; every `every` samples, from `skip`. */
static int windows(const motion *m, int a, int b, int reach, int every, int skip, int *start)
{
    int count = 0, k, i;
    for (k = a; k < b; k++)
        for (i = m->first[k] + skip; i + reach < m->first[k + 1]; i += every)
            start[count++] = i;
    return count;
}

/* Samples of a step of at most `longest` seconds; at least 1. */
static int stride_of(const motion *m, double longest)
{
    const int stride = (int)(longest / m->dt + 1e-6);
    return stride > 1 ? stride : 1;
}

/* Where training samples, steps = 0, or windows may begin: nowhere at the ends, where qdd is one-sided. */
typedef struct {
    int *start, count, steps, stride;
} pool;

static pool pool_of(int steps, int stride)
{
    pool p = {.steps = steps, .stride = stride};
    p.start = room((size_t)d.samples, sizeof *p.start);
    do
        p.count = windows(&d, 0, train, steps > 0 ? p.steps * stride : 1, 1, 1, p.start);
    while (p.count == 0 && p.steps-- > 1);
    return p;
}

/* ---- 4 errors ---- */

/* A window fails if its roll-out ends with a status, or this many times farther off than the recording is wide. */
#define FAR 100

/* E_q, E_qd of the windows that did not fail, their standard errors, and how many of how many failed; typical: the geometric mean
   of E_q over the trajectories, in which a wild one counts no more than others. If a part f of the windows of one failed, its E_q
   counts to the power of 1 - f, times FAR^f: so a few do not decide which weights are best, and yet each is a loss. Of each joint:
   E_q, NaN if it does not move, and the rms of q_pred - q in its unit; worst: the joint with the largest E_q. */
typedef struct {
    double q, qd, q_off, qd_off, typical, joint_q[M(N)], joint_rms[M(N)];
    int failed, windows, worst;
} error;

typedef struct {
    double sum[4];         /* of |q_pred - q|^2, |q - qbar|^2, |qd_pred - qd|^2, |qd|^2 */
    double joint[M(N)][2]; /* of |q_pred - q|^2, |q - qbar|^2 of each joint */
    int failed, windows;
} score;

typedef struct {
    const motion *m;
    const M(params) *p;
    int from, count, samples, stride, every, *start;
    score *scores; /* of trajectories from .. from + count - 1 */
} rollout;

/* How much of a longer work such roll-outs are. */
static struct {
    const char *what;
    double done, part;
} bar;

/* Adds what M(errors) found of some windows. */
static void add_errors(const roln_error *all, const roln_error *joints, score *to)
{
    int j;
    to->sum[0] += (double)all->q, to->sum[1] += (double)all->q_var;
    to->sum[2] += (double)all->qd, to->sum[3] += (double)all->qd_var;
    for (j = 0; j < (int)M(N); j++)
        to->joint[j][0] += (double)joints[j].q, to->joint[j][1] += (double)joints[j].q_var;
}

/* The windows of trajectory `at` one by one, without those that fail. */
static void roll_each(const rollout *r, int at, roln_batch b, roln_real dt, score *to, int thread)
{
    enum { N = M(N) };
    const roln_real *each = M(trained)(r->p).each;
    const int *start = b.start, windows = b.count, a = r->m->first[at], end = r->m->first[at + 1];
    double wide = 0;
    int w, i, j;
    for (i = a; i < end; i++)
        for (j = 0; j < N; j++) {
            const roln_real q = r->m->q[i * N + j];
            const double x = (double)(q - roln_lnn_near(&M(model).lnn, j, q, s.qbar[j])) / (each ? (double)each[j] : 1);
            wide += x * x / (end - a);
        }
    b.count = 1;
    for (w = 0; w < windows; w++) {
        const int end_of = b.steps > 0;
        roln_error e[2], joints[2 * N];
        b.start = start + w;
        if (M(errors)(r->p, &b, dt, end_of ? b.steps : 1, s.qbar, e, joints, &work[thread]) ||
            (double)e[end_of].q > FAR * FAR * wide)
            to->failed++;
        else
            add_errors(e + end_of, joints + end_of * N, to);
    }
}

/* Windows of one trajectory. */
static void roll(void *ctx, int k, int thread)
{
    const rollout *r = ctx;
    enum { N = M(N) };
    const int at = r->from + k, steps = r->samples / r->stride, end = steps > 0;
    const roln_real dt = (roln_real)(r->m->dt * r->stride);
    int *start = r->start + r->m->first[at];
    score *to = &r->scores[k];
    roln_error e[2], joints[2 * N];
    roln_batch b = {.steps = steps, .stride = r->stride, .start = start, .q = r->m->q, .qd = r->m->qd};
    b.tau = set("torque") > 0 ? r->m->tau : NULL;
    b.count = to->windows = windows(r->m, at, at + 1, r->samples, r->every, 0, start);
    if (thread == 0) progress(bar.what, bar.done + bar.part * k / r->count);
    if (b.count == 0) return;
    if (M(errors)(r->p, &b, dt, end ? steps : 1, s.qbar, e, joints, &work[thread]) ||
        (double)e[end].q > FAR * FAR * (double)e[end].q_var)
        roll_each(r, at, b, dt, to, thread);
    else
        add_errors(e + end, joints + end * N, to);
}

/* sqrt(sum a / sum b), and its standard error: each trajectory left out in turn (jackknife). */
static double ratio(int count, const score *scores, int which, double *off)
{
    double a = 0, b = 0, mean = 0, square = 0;
    int counted = 0, k;
    for (k = 0; k < count; k++)
        a += scores[k].sum[which], b += scores[k].sum[which + 1], counted += scores[k].sum[which + 1] > 0;
    for (k = 0; k < count; k++) {
        const double e = sqrt(fabs(a - scores[k].sum[which]) / fmax(b - scores[k].sum[which + 1], 1e-30));
        if (!(scores[k].sum[which + 1] > 0)) continue; /* too short for a window, or all failed */
        mean += e / counted, square += e * e / counted;
    }
    *off = counted > 1 ? sqrt(fmax(0, square - mean * mean) * (counted - 1)) : (double)NAN; /* of one nobody knows */
    return b > 0 ? sqrt(a / b) : (double)NAN;
}

/* log E_q of a trajectory, failed windows by their part. */
static double log_of(const score *x)
{
    const double f = x->windows > 0 ? (double)x->failed / x->windows : 0;
    return (1 - f) * log(fmin(sqrt(fmax(x->sum[0], 1e-30) / fmax(x->sum[1], 1e-30)), 1e6)) + f * log(FAR);
}

/* E_q and rms of each joint, and which of those that move is the worst. */
static void of_joints(int count, const score *scores, error *e)
{
    const int good = e->windows - e->failed;
    int moves, j, k;
    for (j = 0; j < (int)M(N); j++) {
        double a = 0, b = 0;
        for (k = 0; k < count; k++)
            a += scores[k].joint[j][0], b += scores[k].joint[j][1];
        moves = b > 1e-10 * good * (double)s.qbar[j] * (double)s.qbar[j];
        e->joint_q[j] = moves ? sqrt(a / b) : (double)NAN, e->joint_rms[j] = good > 0 ? sqrt(a / good) : (double)NAN;
        if (moves && !(e->joint_q[j] <= e->joint_q[e->worst])) e->worst = j;
    }
}

/* Errors after `samples` samples in steps of `stride`, of windows every `every` samples of trajectories from .. from + count - 1;
   one by one in scores. */
static error errors(const motion *m, const M(params) *p, int from, int count, int samples, int stride, int every, score *scores)
{
    rollout r = {m, p, from, count, samples, stride, every, NULL, scores};
    error e = {0};
    int k;
    memset(scores, 0, (size_t)count * sizeof *scores);
    r.start = room((size_t)m->samples, sizeof *r.start);
    share(count, roll, &r);
    e.q = ratio(count, scores, 0, &e.q_off), e.qd = ratio(count, scores, 2, &e.qd_off);
    for (k = 0; k < count; k++)
        e.typical += log_of(&scores[k]) / count, e.failed += scores[k].failed, e.windows += scores[k].windows;
    e.typical = exp(e.typical);
    of_joints(count, scores, &e);
    free(r.start);
    return e;
}

/* In per cent; - where that says nothing. */
typedef struct { char text[16]; } percent;

static percent in_percent(double x)
{
    percent p;
    snprintf(p.text, sizeof p.text, x < 100 ? "%.3f" : "-", 100 * x);
    return p;
}

/* What failed, if anything did. */
typedef struct { char text[64]; } failures;

static failures failed_of(const error *e)
{
    failures f = {""};
    if (e->failed > 0) snprintf(f.text, sizeof f.text, "  %d of %d windows failed", e->failed, e->windows);
    return f;
}

/* Errors over the time that is predicted ahead, printed and as lines of a CSV. */
static void table(const char *name, const motion *m, int from, int to, FILE *csv)
{
    enum { ROWS_OF_IT = 10 };
    static const double ms[ROWS_OF_IT] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2995};
    const int every = stride_of(m, 0.025), stride = stride_of(m, 0.005);
    int samples[ROWS_OF_IT], steps[ROWS_OF_IT], rows = 0, longest = 0, i, j;
    score *scores = room((size_t)(to - from), sizeof *scores);
    double all = 0, done = 0;
    for (i = from; i < to; i++)
        longest = longest > m->first[i + 1] - m->first[i] ? longest : m->first[i + 1] - m->first[i];
    for (i = 0; i < ROWS_OF_IT; i++) {
        const int x = (int)(ms[i] * 1e-3 / m->dt + 0.5);
        if ((rows > 0 && x == samples[rows - 1]) || x >= longest) continue;
        samples[rows] = x, steps[rows] = x / (x % stride ? 1 : stride) + 1;
        all += steps[rows++];
    }
    printf("%s\n   ms    E_q %%      +-   E_qd %%      +-   worst joint   E_q %%       rms\n", name);
    for (i = 0; i < rows; i++) {
        error e;
        bar.what = "table of errors", bar.done = done / all, bar.part = steps[i] / all;
        e = errors(m, &s.p, from, to - from, samples[i], samples[i] % stride ? 1 : stride, every, scores);
        done += steps[i];
        printf("%5.4g %8s %7s %8s %7s %13d %7s %9.3g%s\n", 1e3 * samples[i] * m->dt, in_percent(e.q).text,
               in_percent(e.q_off).text, in_percent(e.qd).text, in_percent(e.qd_off).text, e.worst + 1,
               in_percent(e.joint_q[e.worst]).text, e.joint_rms[e.worst], failed_of(&e).text);
        fflush(stdout);
        fprintf(csv, "\"%s\",%g,%.5g,%.5g,%.5g,%.5g,%d,%d,%d", name, 1e3 * samples[i] * m->dt, 100 * e.q, 100 * e.q_off, 100 * e.qd,
                100 * e.qd_off, e.failed, e.windows, e.worst + 1);
        for (j = 0; j < (int)M(N); j++)
            fprintf(csv, ",%.5g,%.5g", 100 * e.joint_q[j], e.joint_rms[j]);
        fprintf(csv, "\n");
    }
    free(scores);
}

/* ---- 5 chart ---- */

/* The encoder on 4,000 samples, until the residual falls by less than 1 % in 20 steps; then the decoder on all. */
static void fit_chart(void)
{
#if ROLN_CHARTED
    enum { SOME = 4000 };
    static M(turn) turn;
    static M(chart) sums;
    static M(start) scratch;
    const int count = d.first[train], some = count < SOME ? count : SOME;
    int start[SOME], steps = 0, k;
    roln_real residual = 1, before = 1;
    roln_status st = ROLN_OK;
    roln_batch b = {.stride = 1, .start = start, .q = d.q, .qd = d.qd};
    b.count = some;
    for (k = 0; k < some; k++)
        start[k] = (int)((double)k * count / some);
    for (k = 1; st == ROLN_OK && (k % 20 || residual < ROLN_C(0.99) * before); k++) {
        if (k % 20 == 0) before = residual;
        if (due()) printf("chart: step %d, the decoder leaves %.3g %% of q, %.0f s\n", steps, 100 * (double)residual, seconds());
        fflush(stdout);
        st = M(chart_turn)(&s.p, &b, &turn, &residual);
        steps += st == ROLN_OK;
    }
    if (st != ROLN_OK && st != ROLN_E_NO_CONVERGENCE) give_up("chart: status %d", (int)st);
    st = M(chart_add)(&s.p, count, d.q, &sums, &scratch);
    if (st == ROLN_OK) st = M(chart_solve)(&s.p, &sums, ROLN_CHART_RIDGE, &residual, &scratch);
    if (st != ROLN_OK) give_up("chart: status %d; a lower degree?", (int)st);
    printf("chart: the decoder leaves %.3g %% of q, after %d steps of the encoder, %.0f s\n", 100 * (double)residual, steps,
           seconds());
#endif
}

/* ---- 6 Gauss-Newton ---- */

typedef struct {
    const pool *samples, *windows;
    const M(params) *p; /* where */
    int again;          /* there the step has come to: residuals alone */
    int start[ROWS], of_windows[PARTS];
    roln_status status[PARTS];
} rows;

static roln_batch batch_of(const pool *p, const int *start, int count)
{
    roln_batch b = {.q = d.q, .qd = d.qd, .start = start, .count = count};
    b.steps = p->steps, b.stride = p->stride;
    b.qdd = p->steps > 0 ? NULL : d.qdd;
    b.tau = set("torque") > 0 ? (p->steps > 0 ? d.tau : d.tau_mid) : NULL;
    return b;
}

/* The rows of a part: windows, if they do not run away, then samples. */
static void fill(void *ctx, int part, int thread)
{
    rows *f = ctx;
    const roln_real weight = s.window_weight * s.window_weight;
    const roln_loss of_window = {.q_pred = weight, .qd_pred = weight / 10},
                    of_sample = {.qdd_pred = 1, .force = (roln_real)set("force")};
    const int from = part * PART;
    int at = from + f->of_windows[part];
    roln_batch b;
    if (at > from) {
        b = batch_of(f->windows, f->start + from, at - from);
        f->status[part] = M(rows)(f->p, &of_window, &b, (roln_real)(d.dt * b.stride), from, f->again, &residuals, &work[thread]);
        if (f->status[part] != ROLN_OK && f->again) return;
        if (f->status[part] != ROLN_OK) f->of_windows[part] = 0, at = from;
    }
    b = batch_of(f->samples, f->start + at, from + PART - at);
    f->status[part] = M(rows)(f->p, &of_sample, &b, 1, at, f->again, &residuals, &work[thread]);
}

/* Fresh rows of residuals and their derivatives, `of_windows` of each part windows. */
static roln_status draw(rows *f, int of_windows)
{
    int k;
    f->p = &s.p, f->again = 0;
    residuals.seed = roln_rand(&s.seed);
    for (k = 0; k < PARTS * PART; k++) {
        const pool *p = k % PART < of_windows ? f->windows : f->samples;
        f->start[k] = p->start[roln_randint(p->count, &s.seed)];
        f->of_windows[k / PART] = of_windows;
    }
    share(PARTS, fill, f);
    for (k = 0; k < PARTS; k++)
        if (f->status[k] != ROLN_OK) return f->status[k];
    return ROLN_OK;
}

/* The windows' weight: one row in twenty is a window, and three times as large as the other rows are. */
static void weigh_windows(rows *f)
{
    double of_window = 0, of_sample = 0;
    roln_status st;
    int k;
    s.window_weight = 1;
    st = draw(f, WINDOWS);
    s.window_weight = 0;
    if (st != ROLN_OK) return;
    for (k = 0; k < PARTS * PART; k++)
        *(k % PART < WINDOWS ? &of_window : &of_sample) += fabs((double)residuals.r[k]);
    for (k = 0; k < PARTS; k++)
        if (f->of_windows[k] < WINDOWS) return; /* some ran away: the model is not yet good enough */
    s.window_weight = (roln_real)(3 * of_sample / (PART - WINDOWS) * WINDOWS / of_window);
    printf("from here on windows of %d steps of %g s\n", f->windows->steps, d.dt * f->windows->stride);
}

/* Rows of the sums, a triangle, that take equal times. */
static void sum(void *ctx, int k, int thread)
{
    static roln_real scratch[THREADS][ROLN_SYM_WORK];
    const double threads = set("threads");
    const int from = (int)(M(newton_side) * sqrt(k / threads)), to = (int)(M(newton_side) * sqrt((k + 1) / threads));
    M(newton_sums)(ctx, PARTS * PART, from, to, &residuals, &s.newton, scratch[thread]);
}

/* One step. If it is refused in spite of more and more damping, the next rows may know better. */
static void newton_step(rows *f)
{
    enum { JUDGES = 4, TRIES = 6 };
    roln_newton_opt opt = {s.memory, 1, 20}; /* rows more than 20 times the mean are few, but they may be true */
    const roln_real damping = s.newton.state.lambda;
    roln_status st;
    int tries, k;
    if (s.window_weight == 0 && f->windows->count > 0 && s.step >= WINDOWS_FROM) weigh_windows(f);
    for (tries = 0; (st = draw(f, s.window_weight > 0 ? WINDOWS : 0)) != ROLN_OK; tries++)
        if (tries == 100) give_up("the model can not be evaluated on the data any more: status %d", (int)st);
    st = M(newton_rows)(&s.p, &opt, PARTS * PART, &residuals, &s.newton);
    if (st != ROLN_OK) give_up("no step from these residuals: status %d; are torques and accelerations right?", (int)st);
    share((int)set("threads"), sum, &opt);
    f->p = &s.newton.next, f->again = 1;
    for (tries = 0; tries < TRIES; tries++) {
        st = M(newton_step)(&s.p, &opt, PARTS * PART, &residuals, &s.newton);
        if (st != ROLN_OK) give_up("step: status %d", (int)st);
        share(JUDGES, fill, f);
        if (M(newton_judge)(&s.p, PARTS * PART, JUDGES * PART, &residuals, &s.newton)) break;
    }
    if (tries == TRIES) roln_newton_over(damping, &s.newton.state);
    for (k = 0; k < M(newton_size); k++)
        s.mean[k] += (s.p.theta[M(newton_from) + k] - s.mean[k]) / (roln_real)(s.step < 8 ? s.step + 1 : 8);
}

/* ---- 7 Adam ---- */

enum { SLICES = 4, BATCH = 64 };

typedef struct {
    const pool *samples;
    int start[BATCH];
    M(gradient) g[SLICES];
    roln_status status[SLICES];
} descent;

static void slice(void *ctx, int k, int thread)
{
    static const roln_loss of_layers = {.q = 2, .qd = 1},
                           of_all = {.q = 2, .qd = 1, .qdd = ROLN_C(0.1), .zdd = ROLN_C(0.1), .qdd_pred = ROLN_C(0.1)};
    descent *a = ctx;
    const roln_batch b = batch_of(a->samples, a->start + k * (BATCH / SLICES), BATCH / SLICES);
    memset(&a->g[k], 0, sizeof a->g[k]);
    a->status[k] = s.stage == ADAM ? M(grad_acc)(&s.p, &of_all, &b, &a->g[k], &work[thread])
                                   : M(grad)(&s.p, &of_layers, &b, 1, &a->g[k], &work[thread]);
}

/* One of `updates` updates. One that is refused changes nothing. */
static void adam_step(descent *a, int updates)
{
    const roln_real rate = roln_schedule((uint32_t)s.step, 100, (uint32_t)updates, ROLN_C(1e-3));
    const roln_opt opt = ROLN_OPT(rate * (roln_real)set("lr_ae"), rate * (roln_real)(s.stage == ADAM ? set("lr_net") : 0));
    int k, i;
    for (i = 0; i < BATCH; i++)
        a->start[i] = a->samples->start[roln_randint(a->samples->count, &s.seed)];
    share(SLICES, slice, a);
    for (k = 0; k < SLICES; k++) {
        if (a->status[k] != ROLN_OK) return;
        for (i = 0; i < M(theta_size) && k > 0; i++)
            a->g[0].theta[i] += a->g[k].theta[i];
        if (k > 0) a->g[0].windows += a->g[k].windows;
    }
    M(update)(&s.p, &opt, &s.optimiser, &a->g[0], &work[0]);
}

/* ---- 8 checkpoint ---- */

static FILE *file(const char *suffix, const char *mode)
{
    char path[512];
    FILE *f;
    snprintf(path, sizeof path, "%s%s", words[OUT].value, suffix);
    f = fopen(path, mode);
    if (!f && *mode != 'r') fail("cannot write %s", path);
    return f;
}

/* OUT.part, written, becomes OUTsuffix: whenever the power fails, either the old file is there or the new one. */
static void put_in_place(FILE *f, const char *suffix)
{
    char part[512], path[512];
    snprintf(part, sizeof part, "%s.part", words[OUT].value);
    snprintf(path, sizeof path, "%s%s", words[OUT].value, suffix);
    if (fclose(f) != 0) fail("cannot write %s", part);
#ifdef _WIN32
    remove(path); /* rename does not replace there */
#endif
    if (rename(part, path) != 0) fail("cannot write %s", path);
}

/* What a checkpoint belongs to. */
typedef struct {
    uint64_t config, data, from; /* checksums */
    double dt;
    size_t size;
    int samples, trajectories;
    char method[8];
    double value[SETTINGS];
} origin;

static uint64_t checksum_of(const roln_real *x, int columns)
{
    uint64_t h = ROLN_FNV;
    int i;
    for (i = 0; i < d.samples; i++)
        h = roln_fnv(columns * (int)sizeof *x, (const unsigned char *)(x + (size_t)i * (size_t)columns), h);
    return h;
}

static origin origin_of(void)
{
    static unsigned char bytes[M(packed_size)];
    static M(params) none;
    static uint64_t data;
    const char *from = words[FROM].value ? words[FROM].value : "";
    static const char *const may_change = "seconds steps threads resume";
    origin o;
    int i;
    memset(&o, 0, sizeof o);
    none.slope = M(model).ae.slope, none.least = M(model).lnn.least;
    M(pack)(&none, bytes);
    if (data == 0) data = checksum_of(d.q, d.N) ^ 3 * checksum_of(d.qd, d.N) ^ 5 * checksum_of(d.tau, d.forces);
    for (i = 0; i < d.trajectories; i++) /* where recordings begin */
        o.data = 3 * o.data + (uint64_t)d.first[i];
    o.config = roln_fnv((int)sizeof bytes, bytes, ROLN_FNV), o.data ^= data, o.dt = d.dt;
    o.from = roln_fnv((int)strlen(from), (const unsigned char *)from, ROLN_FNV);
    o.size = sizeof s, o.samples = d.samples, o.trajectories = d.trajectories;
    snprintf(o.method, sizeof o.method, "%s", words[METHOD].value);
    for (i = 0; i < SETTINGS; i++)
        o.value[i] = strstr(may_change, settings[i].key) ? 0 : settings[i].value;
    return o;
}

static void checkpoint(void)
{
    const origin o = origin_of();
    FILE *f = file(".part", "wb");
    s.seconds = seconds(), began = now();
    if (fwrite(&o, sizeof o, 1, f) != 1 || fwrite(&s, sizeof s, 1, f) != 1) fail("cannot write %s.part", words[OUT].value);
    put_in_place(f, ".check");
}

/* Nonzero if there was a checkpoint to go on from. */
static int resume(void)
{
    const origin o = origin_of();
    origin was;
    FILE *f = set("resume") > 0 ? file(".check", "rb") : NULL;
    if (!f) return 0;
    if (fread(&was, sizeof was, 1, f) != 1 || memcmp(&was, &o, sizeof o) != 0 || fread(&s, sizeof s, 1, f) != 1)
        fail("%s.check is of other data, other settings or another config", words[OUT].value);
    fclose(f);
    printf("on from step %d of: %s\n", s.step, stage_names[s.stage]);
    return 1;
}

/* ---- 9 pictures ---- */

/* E_q of held-out trajectories, near and far, over seconds; logarithmic. */
static void draw_curve(double near, double far)
{
    static const char *const colour[] = {"#08519c", "#a63603"};
    const double end = fmax(s.point[s.points - 1][0], 1), ahead[] = {near, far};
    int k, i;
    FILE *f = file(".svg", "w");
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='640' height='400' viewBox='0 0 640 400' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='640' height='400' fill='#fff'/>\n"
               "<text x='60' y='28' font-size='15'>" STRING(MODEL) ": E_q of held-out trajectories</text>\n");
    for (k = -3; k <= 2; k++)
        fprintf(f, "<path d='M60 %dh560' stroke='#e4e4e4'/><text x='54' y='%d' text-anchor='end'>%g %%</text>\n", 180 - 60 * k,
                184 - 60 * k, pow(10, k));
    for (k = 0; k <= 4; k++)
        fprintf(f, "<text x='%d' y='382' text-anchor='middle'>%.0f%s</text>\n", 60 + 135 * k, end * k / 4, k == 4 ? " s" : "");
    for (i = 0; i < 2; i++) {
        fprintf(f, "<text x='%d' y='50' fill='%s'>%.3g ms ahead</text>\n<path fill='none' stroke-width='2' stroke='%s' d='",
                60 + 140 * i, colour[i], 1e3 * ahead[i], colour[i]);
        for (k = 0; k < s.points; k++)
            fprintf(f, "%c%.1f %.1f", k ? 'L' : 'M', 60 + 540 * s.point[k][0] / end,
                    180 - 60 * log10(fmin(fmax(100 * s.point[k][1 + i], 1e-3), 100)));
        fprintf(f, "'/>\n");
    }
    fprintf(f, "</svg>\n");
    fclose(f);
}

enum { ACROSS = 440, DOWN = 110, CURVES = 4 };

/* Joint j of a trajectory, and as it is predicted, x [points][N]: NaN where that failed. */
static void draw_joint(FILE *f, int at, int j, const double *x, int points, int stride, int left, int top)
{
    enum { N = M(N) };
    const int a = d.first[at], thin = points / 300 + 1;
    double low = (double)d.q[a * N + j], high = low, scale;
    int i, pen = 0;
    for (i = a; i < d.first[at + 1]; i++)
        low = fmin(low, (double)d.q[i * N + j]), high = fmax(high, (double)d.q[i * N + j]);
    scale = (DOWN - 30) / fmax(high - low, 1e-9);
    fprintf(f, "<text x='%d' y='%d'>joint %d, %.3g .. %.3g</text>\n<path fill='none' stroke-width='2' stroke='#999' d='", left,
            top + 12, j + 1, low, high);
    for (i = 0; i < points; i += thin)
        fprintf(f, "%c%.1f %.1f", i ? 'L' : 'M', left + (ACROSS - 40.0) * i / points,
                top + 20 + scale * (high - (double)d.q[(a + i * stride) * N + j]));
    fprintf(f, "'/>\n<path fill='none' stroke='#a63603' d='");
    for (i = 0; i < points; i += thin) {
        const double y = scale * (high - x[i * N + j]);
        if (!(y > -20 && y < DOWN - 10)) {
            pen = 0;
            continue;
        }
        fprintf(f, "%c%.1f %.1f", pen ? 'L' : 'M', left + (ACROSS - 40.0) * i / points, top + 20 + y);
        pen = 1;
    }
    fprintf(f, "'/>\n");
}

/* A trajectory as the model predicts it from its first sample, and every `far` samples anew from the recording: x [points][N]. */
static void predict(int at, int stride, int far, int points, double *x)
{
    enum { N = M(N), F = M(force_size) };
    static M(work) scratch;
    M(state) now_at;
    M(latent) z;
    roln_status st = ROLN_OK;
    int i, j, k;
    for (k = 0; k < points; k++) {
        const int sample = d.first[at] + k * stride;
        roln_real tau[F];
        if (k * stride % far == 0) {
            memcpy(now_at.q, d.q + sample * N, sizeof now_at.q), memcpy(now_at.qd, d.qd + sample * N, sizeof now_at.qd);
            st = M(encode)(&s.p, &now_at, &z, &scratch);
        } else if (st == ROLN_OK) {
            for (j = 0; j < F; j++)
                for (i = 0, tau[j] = 0; i < stride; i++)
                    tau[j] += d.tau[(sample - stride + i) * F + j] / (roln_real)stride;
            st = M(step)(&s.p, &z, set("torque") > 0 ? tau : NULL, (roln_real)(d.dt * stride), &scratch);
        }
        if (st == ROLN_OK) st = M(decode)(&s.p, &z, &now_at, &scratch);
        for (j = 0; j < N; j++)
            x[k * N + j] = st == ROLN_OK ? (double)now_at.q[j] : (double)NAN;
    }
}

/* The joints of a trajectory that move most, in their own units if they have such. */
static void widest(int at, int count, int *which)
{
    enum { N = M(N) };
    const roln_real *each = M(trained)(&s.p).each;
    double wide[N];
    int i, j, k;
    for (j = 0; j < N; j++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (i = d.first[at]; i < d.first[at + 1]; i++)
            low = fmin(low, (double)d.q[i * N + j]), high = fmax(high, (double)d.q[i * N + j]);
        wide[j] = (high - low) / (each ? (double)each[j] : 1);
    }
    for (k = 0; k < count; k++) {
        for (j = 1, which[k] = 0; j < N; j++)
            if (wide[j] > wide[which[k]]) which[k] = j;
        wide[which[k]] = -1;
    }
}

/* OUT_motion.svg: the held-out trajectories that are predicted with the median and the worst E_q. */
static void draw_motion(void)
{
    enum { N = M(N), JOINTS = (int)N < (int)CURVES ? (int)N : (int)CURVES };
    static const char *const title[] = {"median", "worst"};
    const int count = d.trajectories - train, stride = stride_of(&d, 0.005);
    const int far = s.ahead > 0 ? (int)(s.ahead / d.dt + 0.5) : stride; /* no look: no stage had anything to do */
    const int height = 60 + JOINTS * DOWN;
    score *scores = room((size_t)count, sizeof *scores);
    int chosen[2] = {0, 0}, k, i, joint[CURVES];
    FILE *f = file("_motion.svg", "w");
    bar.what = "picture", bar.done = 0, bar.part = 1;
    errors(&d, &s.p, train, count, far, stride, stride_of(&d, 0.1), scores);
    for (k = 0; k < count; k++) {
        int below = 0;
        for (i = 0; i < count; i++)
            below += log_of(&scores[i]) < log_of(&scores[k]) || (log_of(&scores[i]) == log_of(&scores[k]) && i < k);
        if (below == count / 2) chosen[0] = k;
        if (below == count - 1) chosen[1] = k;
    }
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='%d' height='%d' viewBox='0 0 %d %d' font-family='Helvetica, Arial, "
               "sans-serif' font-size='12' fill='#222'>\n<rect width='%d' height='%d' fill='#fff'/>\n",
            2 * ACROSS, height, 2 * ACROSS, height, 2 * ACROSS, height);
    for (k = 0; k < 2; k++) {
        const int at = train + chosen[k], points = (d.first[at + 1] - d.first[at] - 1) / stride + 1;
        double *x = room((size_t)points * N, sizeof *x);
        fprintf(f, "<text x='%d' y='24' font-size='15'>%s: trajectory %d of %d, E_q %s %%</text>\n<text x='%d' y='42'>%.3g s: grey "
                   "recorded, red predicted, anew every %.3g s</text>\n",
                20 + k * ACROSS, title[k], at + 1, d.trajectories, in_percent(exp(log_of(&scores[chosen[k]]))).text,
                20 + k * ACROSS, points * stride * d.dt, s.ahead);
        predict(at, stride, far, points, x);
        widest(at, JOINTS, joint);
        for (i = 0; i < JOINTS; i++)
            draw_joint(f, at, joint[i], x, points, stride, 20 + k * ACROSS, 50 + i * DOWN);
        free(x);
    }
    fprintf(f, "</svg>\n");
    fclose(f), free(scores);
}

/* ---- 10 stages ---- */

/* Steps of Gauss-Newton without a gain that are one too many. */
static int patience(void)
{
    return s.since / 4 > 60 ? s.since / 4 : 60;
}

/* Near the end the memory of older steps leads astray: back to the best weights, with half of it. */
static void turn_back(void)
{
    s.p = s.best, s.memory /= 2;
    memcpy(s.mean, s.p.theta + M(newton_from), sizeof s.mean);
    memset(s.newton.carried, 0, sizeof s.newton.carried);
    printf("back to step %d, with a memory of %g steps\n", s.best_step, (double)s.memory);
    s.since = s.step;
}

/* How the weights, averaged where that makes sense, predict held-out trajectories 25 ms and `look` seconds ahead; of layers alone,
   how they reconstruct them. Keeps the best. */
static void look(void)
{
    const int stride = stride_of(&d, 0.005);
    score *scores = room((size_t)(d.trajectories - train), sizeof *scores);
    int shortest = d.samples, k, far, near;
    M(params) p = s.p;
    error e[2];
    for (k = train; k < d.trajectories; k++)
        if (d.first[k + 1] - d.first[k] < shortest) shortest = d.first[k + 1] - d.first[k];
    far = s.stage == LAYERS ? 0 : (int)fmax(1, fmin(set("look"), shortest / 2 * d.dt) / d.dt / stride + 0.5) * stride;
    near = (int)fmin(stride_of(&d, 0.025) / stride * stride, far);
    if (s.stage == NEWTON && FLAT && s.step > 0) memcpy(p.theta + M(newton_from), s.mean, sizeof s.mean);
    bar.what = "look", bar.done = 0, bar.part = near / fmax(near + far, 1);
    e[0] = errors(&d, &p, train, d.trajectories - train, near, stride, stride_of(&d, 0.1), scores);
    bar.done = bar.part, bar.part = 1 - bar.part;
    e[1] = errors(&d, &p, train, d.trajectories - train, far, stride, stride_of(&d, 0.1), scores);
    free(scores);
    s.ahead = far * d.dt;
    if (s.step == 0 || e[1].typical < s.best_error) s.best_error = e[1].typical, s.best = p, s.best_step = s.since = s.step;
    printf("%7d  E_q(%.3g ms) %7s %%  E_q(%.3g s) %7s +- %s %%, typical %s %%", s.step, 1e3 * near * d.dt, in_percent(e[0].q).text,
           far * d.dt, in_percent(e[1].q).text, in_percent(e[1].q_off).text, in_percent(e[1].typical).text);
    if (s.stage == NEWTON)
        printf("  residual %.2e  damping %.0e", sqrt((double)s.newton.state.loss / ROWS), (double)s.newton.state.lambda);
    printf("%s  %.0f s\n", failed_of(&e[1]).text, seconds());
    fflush(stdout);
    if (s.points < POINTS) s.point[s.points][0] = seconds(), s.point[s.points][1] = e[0].q, s.point[s.points++][2] = e[1].q;
    draw_curve(near * d.dt, far * d.dt);
    if (s.stage == NEWTON && s.step > WINDOWS_FROM && s.memory > 2 &&
        (e[1].typical > 2 * s.best_error || s.step >= s.since + patience()))
        turn_back();
}

/* Updates of a stage; of Gauss-Newton 1: it ends by itself. */
static int updates_of(int stage)
{
    const int adam = strcmp(words[METHOD].value, "adam") == 0;
    const int layers = (int)M(n) < (int)M(N) && M(degree) == 0; /* n = N reconstructs q exactly */
    return stage == LAYERS ? layers * (int)set("ae") : stage == ADAM ? adam * (int)set("acc") : !adam;
}

/* Gauss-Newton ends when a short memory gains nothing either. */
static int done(int updates)
{
    if (set("seconds") > 0 && seconds() > set("seconds")) return 1;
    if (s.stage != NEWTON) return s.step >= updates;
    return set("steps") > 0 ? s.step >= (int)set("steps") : (s.memory <= 2 && s.step >= s.since + patience());
}

/* One stage, from where it stands to its end: then p is what predicted best. Looks at Gauss-Newton come at growing intervals. */
static void run(void)
{
    static const roln_newton fresh = ROLN_NEWTON_START;
    static rows f;
    static descent a;
    const int updates = updates_of(s.stage), stride = stride_of(&d, 0.02), most = (int)(set("window") / d.dt / stride + 0.5);
    int at = s.step;
    pool samples = pool_of(0, 1), longer = pool_of(most < M(horizon) ? most : M(horizon), stride);
    if (longer.steps == 0) longer.count = 0;
    f.samples = a.samples = &samples, f.windows = &longer;
    if (samples.count < 1) fail("trajectories of at least 3 samples are needed");
    if (s.next == 0) s.newton.state = fresh, s.memory = 8, printf("%s\n", stage_names[s.stage]);
    while (s.next == 0 || !done(updates)) {
        if (s.step == s.next) {
            at = s.step;
            s.next += s.stage == NEWTON ? 4 + s.next / 8 : updates / 20 + 1;
            look();
            checkpoint();
        }
        progress("to the next look", (double)(s.step - at) / (s.next - at));
        if (s.stage == NEWTON) newton_step(&f);
        else adam_step(&a, updates);
        s.step++;
    }
    look();
    s.p = s.best, s.step = s.next = 0;
    free(samples.start), free(longer.start);
}

/* ---- 11 main ---- */

/* The unit of inertia, from the torques of 4,000 samples: of a machine in Nm that weighs grams, or one of tons. */
static void fit_inertia(void)
{
    const pool samples = pool_of(0, 1);
    const int count = samples.count < 4000 ? samples.count : 4000;
    roln_batch b;
    int k;
    for (k = 0; k < count; k++)
        samples.start[k] = samples.start[(int)((double)k * samples.count / count)];
    b = batch_of(&samples, samples.start, count);
    if (M(fit_inertia)(&s.p, &b, work) != ROLN_OK)
        printf("warning: torque=1, but the torques are 0: M and V are known up to a factor\n");
    else if (s.p.scale.m != 1) printf("unit of inertia: %g\n", (double)s.p.scale.m);
    free(samples.start);
}

/* The POD, then the chart; or the packed weights that the user names. */
static void start(void)
{
    static M(start) scratch;
    static unsigned char bytes[M(packed_size) + 1]; /* of a longer file, too many */
    s.seed = (uint64_t)set("seed");
    if (M(init_pod)(&s.p, d.first[train], d.q, d.qd, s.qbar, &s.seed, &scratch) != ROLN_OK)
        fail("no start from this data: it does not move, or its numbers are too large");
    if (words[FROM].value) {
        FILE *f = fopen(words[FROM].value, "rb");
        const roln_status st = f ? M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &s.p) : ROLN_OK;
        if (!f) fail("cannot read %s", words[FROM].value);
        if (st != ROLN_OK)
            fail("cannot start from %s: %s", words[FROM].value,
                 st == ROLN_E_FORMAT ? "no .roln of this version" :
                 st == ROLN_E_LENGTH ? "it is cut off, or goes on behind its end" :
                 st == ROLN_E_CHECKSUM ? "it is damaged" : "it is of another config");
        fclose(f);
    } else {
        fit_chart();
        if (set("torque") > 0) fit_inertia();
    }
}

static void put_file(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

static void save(void)
{
    static unsigned char bytes[M(packed_size)];
    static M(work) scratch;
    FILE *f;
    s.p.dt = (roln_real)(d.dt * stride_of(&d, 0.005));
    if (M(fit_range)(&s.p, d.first[train], d.q, d.qd, &scratch) != ROLN_OK) give_up("no range");
    M(pack)(&s.p, bytes);
    f = file(".part", "wb");
    if (fwrite(bytes, 1, sizeof bytes, f) != sizeof bytes) fail("cannot write %s.roln", words[OUT].value);
    put_in_place(f, ".roln");
    f = file(".part", "w");
    if (M(write)(&s.p, put_file, f) != ROLN_OK || ferror(f)) fail("cannot write %s_weights.h", words[OUT].value);
    put_in_place(f, "_weights.h");
    printf("wrote %s.roln and %s_weights.h after %.0f s\n", words[OUT].value, words[OUT].value, seconds());
    printf("held-out trajectories are predicted with a typical E_q of %.3f %% after %.3g s\n", 100 * s.best_error, s.ahead);
    if (!(s.best_error < 1))
        printf("that is no better than the mean of q: do all columns have the order, the unit and the sign that they "
               "should%s?\n",
               set("torque") > 0 ? ", and tau the time, of the sample from which on it acts" : "");
}

/* Says what becomes of positions without velocities, and does it. */
static void smooth_positions(motion *m)
{
    const int half = (int)set("smooth");
    printf("%s: %s, so q, qd, qdd smoothed over %d samples\n", m->path, m->has_qd ? "smooth=" : "no qd", 2 * half + 1);
    smooth(m, half);
}

/* Reads motion.csv, and a second file if there is one. */
static motion read_all(const char *path)
{
    wanted w = {STRING(MODEL), M(N), M(inputs), set("torque") > 0, (int)set("smooth"), 0, M(angles)};
    motion unseen = {0};
    if (words[TEST].value) unseen = read_recording(words[TEST].value, &w);
    w.qd_unused = set("noise") > 0 || set("smooth") > 0;
    d = read_recording(path, &w);
    train = d.trajectories - (int)ceil(d.trajectories * set("held"));
    if (train < 1 || train >= d.trajectories)
        fail("%d trajectories and held=%g: at least 1 to train with and 1 held out are needed", d.trajectories, set("held"));
    printf("%d trajectories (%d held out), %d samples of %g s, N = %d, n = %d, %d parameters\n", d.trajectories,
           d.trajectories - train, d.samples, d.dt, (int)M(N), (int)M(n), (int)M(theta_size));
    if (d.has_tau && !(set("torque") > 0)) printf("columns tau count for nothing without torque=1\n");
    if (set("noise") > 0) {
        double sd[M(N)];
        add_noise(&d, set("noise"), M(own), (uint64_t)set("seed") + 5000, sd);
        printf("noise of standard deviation %.3g added to q%s\n", sd[0], M(own) ? "1, and to each joint in its measure" : "");
    }
    if (set("smooth") > 0) smooth_positions(&d);
    if (words[TEST].value && !unseen.has_qd) smooth_positions(&unseen);
    return unseen;
}

int main(int argc, char **argv)
{
    motion unseen;
    FILE *csv;
    int i;
    for (i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) return help(), DONE;
    if (argc < 2) fail("usage: train motion.csv [key=value ...]; --help explains the keys");
    began = now();
    read_settings(argc, argv);
    unseen = read_all(argv[1]);
    fclose(file(".part", "wb")); /* now rather than after the training */
    if (!resume()) start();
    for (; s.stage < STAGES; s.stage++)
        if (updates_of(s.stage) > 0) run();
    save();
    csv = file("_errors.csv", "w");
    fprintf(csv, "recordings,ms,E_q_percent,E_q_error,E_qd_percent,E_qd_error,failed,windows,worst_joint");
    for (i = 1; i <= (int)M(N); i++)
        fprintf(csv, ",E_q%d_percent,rms_q%d", i, i);
    fprintf(csv, "\n");
    table(set("noise") > 0 || set("smooth") > 0 ? "held-out trajectories, altered as above" : "held-out trajectories", &d, train,
          d.trajectories, csv);
    if (words[TEST].value) table(words[TEST].value, &unseen, 0, unseen.trajectories, csv);
    if (ferror(csv) || fclose(csv) != 0) fail("cannot write %s_errors.csv", words[OUT].value);
    draw_motion();
    return DONE;
}
