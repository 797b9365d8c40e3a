/* SPDX-License-Identifier: MIT */
/* train.c - train a model on recorded motion.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. -Iexamples -DMODEL=arm examples/train.c -o train -lpthread -lm
   ./train motion.csv .. [key=value ...]
   ./train --help

   MODEL is the ROLN_NAME of a config header, which is named after it (arm.h: the sizes, see roln.h). motion.csv has the columns
   t, q.., qd.., tau.. and a blank line between trajectories; recording.h reads and checks it. Several files, folders, and with q=
   other columns are read, too (files.h); held.h says which part is held out. Without pthreads: -DNO_THREADS, as always on Windows;
   one thread then, and the same bits. On several machines, with MPI:
   mpicc for cc, -DROLN_MPI (docs/training.md, "Many machines"); the bits are the same. Stages, each of which ends with the weights
   that predicted held-out trajectories best:

     chart     with ROLN_CHART: the encoder that a polynomial decoder undoes best, then the decoder in closed form
     layers    of an autoencoder without chart: Riemannian Adam on their reconstruction
     networks  recursive Gauss-Newton on accelerations, then also on windows of half a second, until held-out trajectories are
               predicted no better; or, method=adam, Riemannian Adam on accelerations, of all parameters together

   With torque=1 and without autoencoder a regression of the torques is fitted and told first (baseline.h), and the networks begin
   there.

   Written at every look at the held-out trajectories: OUT.svg, the learning curve, and OUT.check, from which resume=1 goes on, with
   the same bits as if nothing had happened. In the end, however a training ends, by itself, by seconds=, by a signal (SIGINT,
   SIGTERM, SIGHUP), by numbers that overflow, by a full disk: OUT_weights.h (C definition for flash) and OUT.roln (packed bytes) of
   the best weights, then a table of errors, also as OUT_errors.csv with the errors of every joint, and OUT_motion.svg, how the
   median and the worst held-out trajectory are predicted (report.h), OUT_report.html, a page of all that was found (page.h), and
   OUT_limits.h, limits of a guard and noise of a filter (fitted.h). With next= OUT_next.csv, what to record next (next.h). The exit
   code is 0 only if a model was trained: `help`. Keys and defaults: `settings`.

   1 settings     2 threads     3 state     4 files     5 chart     6 Gauss-Newton     7 Adam     8 checkpoint     9 stages
   10 weights     11 main */

#if defined _WIN32 && !defined NO_THREADS
#define NO_THREADS
#endif
#if !defined NO_THREADS || defined ROLN_MPI
#define _POSIX_C_SOURCE 200809L
#endif
#ifndef NO_THREADS
#include <pthread.h>
#endif
#include <errno.h>
#ifdef _POSIX_C_SOURCE
#include <fcntl.h>
#endif
#include <signal.h>

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) <m.h>
#define HEADER(m) HEADER_(m)
#define ROLN_GN_ROWS 2000 /* samples of a step of Gauss-Newton */
#include HEADER(MODEL)
#include "recording.h"
#include "processes.h"
#include "files.h"
#include "whole.h"
#include "regression.h"

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
    {"seconds", 0, 0, 1e8, 0, "this run ends after so many, with all that it writes; 0: no limit, and the same bits in every run"},
    {"steps", 0, 0, 1e8, 1, "end after so many steps of Gauss-Newton; 0: when held-out recordings are predicted no better"},
    {"dt", 0, 0, 1e6, 0, "s from sample to sample of the recordings: resampled to it; 0: as they are; without t: rows are counted"},
    {"look", 1, 0, 3600, 0, "s that these are predicted ahead, to see which weights are best; at most half of the median one"},
    {"window", 0.5, 0, 3600, 0, "s, length of a window: at most ROLN_HORIZON steps of 20 ms, or of one sample if longer; 0: none"},
    {"torque", 0, 0, 1, 1, "1: use the columns tau, or u of ROLN_INPUTS, ROLN_ACTUATOR; 0: no force does work"},
    {"force", (int)M(n) == (int)M(N) && M(inputs) == 0 && M(actuator) == 0, 0, 1e6, 0,
     "torque=1: weight of torques beside accelerations, each in parts of its variance; autoencoder, inputs: 0"},
    {"inertia", 0, 0, 1e15, 0, "torque=1: unit of inertia of the networks, as of another training; 0: found in the recordings"},
    {"ridge", 0.02, 0, 1e6, 0, "ROLN_POLYNOMIALS: keeps coefficients small, in parts of the residuals"},
    {"noise", 0, 0, 100, 0, "Gaussian noise added to q of motion.csv, over rms(q - mean), with ROLN_SCALE each of each joint"},
    {"smooth", 0, 0, 100000, 1, "q, qd, qdd of motion.csv from a parabola through this many samples of q on each side; 0: none"},
    {"next", 0, 0, 200, 1, "OUT_next.csv: so many recordings that would tell most beside these; takes a tenth of seconds="},
    {"tick", 0, 0, 1e6, 0, "s, tick of your controller, which OUT_limits.h is for; 0: the step of the recordings"},
    {"false_alarms", 0, 0, 0.5, 0, "part of the windows that limits.residual of OUT_limits.h lets be beyond it; 0: a fixed limit"},
    {"ae", 20000, 0, 1e8, 1, "layers: updates of Adam on their reconstruction"},
    {"acc", 100000, 0, 1e8, 1, "method=adam: updates on accelerations"},
    {"lr_ae", 0.1, 0, 100, 0, "Adam: learning rate of the layers (Frobenius length of a step); less in wide ones"},
    {"lr_net", 3e-3, 0, 100, 0, "Adam: learning rate of the networks"},
    {"threads", 2, 1, 16, 1, "on which it runs; changes no bit"},
    {"resume", 0, 0, 1, 1, "1, or --resume: go on from OUT.check; without it that is kept as OUT.check.old"},
};
enum { SETTINGS = sizeof settings / sizeof *settings };
static char was_given[SETTINGS]; /* nonzero: by an argument */
static struct {
    const char *key, *value, *help;
} words[] = {
    {"out", STRING(MODEL), "what the names of all files that are written begin with"},
    {"t", NULL, "column map: the column of time, by number or name, perhaps with a unit: t=1,ms; none: rows are counted, with dt="},
    {"q", NULL, "columns of q: q=2:7, q=pos*, q=2:7,deg; units rad deg turns counts/4096 m cm mm raw, gains behind *"},
    {"qd", NULL, "columns of qd: rad/s deg/s rpm turns/s counts/s/4096 m/s cm/s mm/s raw; without: the derivative of q"},
    {"tau", NULL, "columns of tau (or u): tau=14:19,A*14.9,13.3,..; Nm mNm kNm Ncm N mN kN A mA raw; 0 for no motor"},
    {"filter", "auto", "Hz: low-pass of q, qd and tau without phase; auto: above what the spectrum shows of motion; off"},
    {"held", "0.1", "what is held out: a part of the recordings, names of files, or none"},
    {"spread", NULL, "more recordings to train with: files, folders, apart by commas; with MPI each is read by one process"},
    {"test", NULL, "a second file of recordings, for a table of errors; smoothed like motion.csv if it has no qd"},
    {"from", NULL, "packed weights to begin with"},
    {"method", "newton", "newton or adam"},
    {"start", "auto", "regression: networks begin at that of the torques; random; auto: regression with torque=1, joints as z"},
    {"sliders", NULL, "for the regression: joints that are no hinges in rad: 2,5"},
    {"ignore", "auto", "joints that are left out of M and V: 1,3; none; auto: what the regression finds if it is the start"},
    {"smoother", NULL, "packed weights of an earlier training: a Kalman smoother on them finds q and qd; without columns qd"},
    {"delay", "0", "torque=1: s from the stamp of tau to its effect, by which it is shifted; auto: what fits the motion best"},
};
enum {
    OUT, T_COLUMN, Q_COLUMNS, QD_COLUMNS, TAU_COLUMNS, FILTER, HELD, SPREAD, TEST, FROM, METHOD, BEGIN, SLIDERS, IGNORE, SMOOTHER,
    DELAY, WORDS
};

enum { UNTRAINED = 3 }; /* exit code beside those of recording.h: weights, but no trained model */

static void help(void)
{
    int i;
    printf("train motion.csv .. [key=value ...]     trains " STRING(
               MODEL) " on recorded motion\n\n"
                      "motion.csv: t in s, %d q, %d qd, %d %s (these may be left out), a blank line between recordings. Several "
                      "files, or\n"
                      "folders of them; with q= other columns. docs/training.md, \"Files of a logger\"\n\n",
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
           "held-out recording, predicted and true), OUT_report.html (all of this on a page), OUT_limits.h (limits of a guard,\n"
           "noise of a filter), OUT.check (to go on from); with next= OUT_next.csv (what to record next).\n"
           "Exit code; if it is not 0, the last lines say why:\n"
           "  0  A model was trained: weights are written, the best step is not the first (it may be that of a regression),\n"
           "     windows were reached (if window= is not 0), and up to look= E_q is at most half of that of q + h qd.\n"
           "     Up to window= E_q is at most 50 %%; the mean of q has 100 %%. After look= it is below 100 %%. Up to look= and\n"
           "     up to window= at most one roll-out in twenty fails.\n"
           "     With torque=1 the torques of the model are off by less than the recorded torques.\n"
           "     Where noise of the torques hides it, E_q before look= need not be better than that of the regression.\n"
           "  3  Weights are written, but one of these is not so.\n"
           "  1  Wrong use, recordings or files, and no weights; or a good model, but a file that could not be written.\n"
           "  2  Nothing to begin with: no chart fits these recordings.\n");
}

static double set(const char *key)
{
    size_t i;
    for (i = 0; i < SETTINGS; i++)
        if (strcmp(settings[i].key, key) == 0) return settings[i].value;
    fail("no setting %s", key);
    return 0;
}

static int is_adam(void)
{
    return strcmp(words[METHOD].value, "adam") == 0;
}

/* The autoencoder is trained by itself: n = N reconstructs q exactly, and a chart is in closed form. */
enum { LAYERED = (int)M(n) < (int)M(N) && (int)M(degree) == 0 };

/* Says which settings change nothing. */
static void tell_unused(void)
{
    const struct {
        const char *keys, *need;
        int there;
    } needs[] = {{" steps ", "method=newton", !is_adam()},
                 {" acc lr_net ", "method=adam", is_adam()},
                 {" ae lr_ae ", "an autoencoder of layers", LAYERED || is_adam()},
                 {" ridge ", "ROLN_POLYNOMIALS", (int)M(polynomials)},
                 {" inertia force ", "torque=1", set("torque") > 0}};
    size_t i, k;
    char key[32];
    for (k = 0; k < SETTINGS; k++)
        for (i = 0; i < sizeof needs / sizeof *needs && was_given[k]; i++) {
            snprintf(key, sizeof key, " %s ", settings[k].key);
            if (strstr(needs[i].keys, key) && !needs[i].there)
                printf("%s= changes nothing here: it counts with %s\n", settings[k].key, needs[i].need);
        }
}

/* Nonzero if inputs act: torque=1, or driven joints. */
static int acts(void)
{
    return set("torque") > 0 || (int)M(driven) > 0;
}

/* settings[k] = text, if that is a number in its range. */
static void read_setting(size_t k, const char *text)
{
    char *end;
    const double x = strtod(text, &end);
    if (end == text || *end || !isfinite(x))
        fail("%s=%s: not a number\nhint: a number, %g .. %g", settings[k].key, text, settings[k].low, settings[k].high);
    if (x < settings[k].low || x > settings[k].high || (settings[k].whole && x != floor(x)))
        fail("%s=%s: expected %s %g .. %g\nhint: --help says what %s= sets", settings[k].key, text,
             settings[k].whole ? "a whole number," : "a number,", settings[k].low, settings[k].high, settings[k].key);
    settings[k].value = x, was_given[k] = 1;
}

static file_list inputs; /* motion.csv .. */
static char **arguments; /* of the program */
static int argument_count;

/* Nonzero if there is a file or a folder of this name. */
static int is_file(const char *path)
{
    FILE *f = fopen(path, "rb");
    if (f) fclose(f);
    return f != NULL;
}

/* The arguments: files, folders, key=value. */
static void read_settings(int argc, char **argv)
{
    int i;
    arguments = argv, argument_count = argc;
    for (i = 1; i < argc; i++) {
        char again[] = "resume=1", *key = strcmp(argv[i], "--resume") == 0 ? again : argv[i], *eq = strchr(key, '=');
        size_t k, known = 0;
        if (!eq || is_file(key)) {
            if (!is_file(key) && inputs.count > 0)
                fail("%s: no file or folder, and not key=value\nhint: --help lists the keys", key);
            add_files(&inputs, key);
            continue;
        }
        *eq = 0;
        for (k = 0; k < WORDS; k++)
            if (strcmp(words[k].key, key) == 0) words[k].value = eq + 1, known = 1;
        for (k = 0; k < SETTINGS; k++)
            if (strcmp(settings[k].key, key) == 0) read_setting(k, eq + 1), known = 1;
        if (!known) fail("unknown setting %s\nhint: --help lists the settings", key);
        *eq = '='; /* for page.h */
    }
    if (inputs.count == 0) fail("no recordings\nhint: train motion.csv [key=value ...]; --help explains the keys");
    if (strcmp(words[METHOD].value, "newton") != 0 && strcmp(words[METHOD].value, "adam") != 0)
        fail("method=%s: expected newton or adam\nhint: leave method= out for newton", words[METHOD].value);
    if (strlen(words[OUT].value) > 480) fail("out=%s: more than 480 letters\nhint: a shorter name", words[OUT].value);
    if (!*words[OUT].value) fail("out= is empty\nhint: the names of all files begin with it: out=%s", STRING(MODEL));
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
        if (t > 0 && pthread_create(&id[t], NULL, work_off, &h[t]) != 0) fail("cannot start %d threads\nhint: threads=1", threads);
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

/* Polynomials: weight of the row that holds the scale of M and V, which is free without forces. */
enum { POLYNOMIALS = (int)M(polynomials), HOLD = 10 };
typedef char polynomials_of_so_many_weights_have_no_ridge[!POLYNOMIALS || (int)M(newton_size) <= 8 * ROWS ? 1 : -1];

/* All that a training is. */
static struct {
    int stage, step, next; /* next: step of the next look; 0: the stage has not begun */
    int best_step, since;  /* since: from where steps without a gain are counted */
    int falls, windowed;   /* how often numbers overflowed since the last gain; 1: there were windows */
    int begun_there;       /* 1: the networks began at the regression */
    int gentle;            /* 1: and the torques are noisy: small steps */
    int thin;              /* looks take every so many windows, where seconds= is short; 0: not yet known */
    uint64_t seed;
    double seconds, best_error, ahead; /* of held-out trajectories, so many seconds ahead */
    double best_score;                 /* least of the scores, of which best_error was a part */
    int points;
    double point[POINTS][3];          /* learning curve: seconds, E_q near and far */
    roln_real memory, window_weight;  /* of Gauss-Newton, in steps; 0: no windows yet */
    roln_real scale, reach;           /* of polynomials: of M at first; how far they are kept from growing, 0: not yet known */
    roln_real qbar[M(N)];
    M(params) p, best;
    M(optimiser) optimiser;
    M(newton) newton;
    roln_real mean[M(newton_size)];  /* of the weights of 8 steps */
} s;

static motion d, unseen; /* of motion.csv, and of test= */
static uint64_t weights_sum;     /* of OUT_weights.h */
static double torque_scale = 1; /* of d, unseen and s, while it trains, in that of the recordings */
static int train; /* its first trajectories; the others are held out */
static double began, launched; /* seconds() and elapsed() count from there */
static char ended[300];        /* why the training ended before its time; empty: by itself */
static char limit[40];         /* the setting that did it in time */
static int last = -1, reached; /* the last stage that ran, -1: none, and its last step */
static int window_count;       /* windows that it could take */
static int begun;              /* 1: s.best are weights that are not yet written */
static volatile sig_atomic_t halted; /* the signal that ends the training; 0: none */
static M(train) work[THREADS];
static M(residuals) residuals;
static roln_real of_force; /* weight of forces in rows of samples */

static double seconds(void)
{
    return s.seconds + now() - began;
}

/* Seconds of this run, and how many are left of it. After a signal there are a few for the table. */
static double elapsed(void)
{
    return now() - launched;
}

static double left(void)
{
    const double most = set("seconds") > 0 ? set("seconds") - elapsed() : HUGE_VAL;
    return halted ? fmin(most, 5) : most;
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

/* ---- 4 files ---- */

static int unwritten; /* files that could not be written */

/* What the files are called. */
typedef struct { char text[512]; } file_name;

static file_name name_of(const char *suffix)
{
    file_name p;
    snprintf(p.text, sizeof p.text, "%s%s", words[OUT].value, suffix);
    return p;
}

/* Says that a file cannot be written. Training goes on: what can be written later is written. */
static void cannot_write(const char *suffix)
{
    unwritten++;
    printf("warning: cannot write %s: %s\n", name_of(suffix).text, strerror(errno));
    fflush(stdout);
}

/* NULL, and a warning, if it cannot be opened. */
static FILE *file(const char *suffix, const char *mode)
{
    FILE *f = fopen(name_of(suffix).text, mode);
    if (!f) cannot_write(suffix);
    return f;
}

/* Zero, and a warning, if not all of it was written. */
static int close_file(FILE *f, const char *suffix)
{
    if (close_whole(f)) return 1;
    cannot_write(suffix);
    return 0;
}

/* OUT.part, written, becomes OUTsuffix. Zero, a warning, and the old file if that is not possible. */
static int put_in_place(FILE *f, const char *suffix)
{
    const int good = put_whole(f, name_of(".part").text, name_of(suffix).text);
    if (!good) cannot_write(suffix);
    return good;
}

static void leave_place(void)
{
    remove(name_of(".lock").text);
}

/* Refuses a place where another training writes. */
static void claim_place(void)
{
#ifdef _POSIX_C_SOURCE
    struct flock all = {0};
    const int lock = open(name_of(".lock").text, O_RDWR | O_CREAT, 0666); /* the system ends it with the program */
    all.l_type = F_WRLCK, all.l_whence = SEEK_SET;
    if (lock >= 0 && fcntl(lock, F_SETLK, &all) != 0 && (errno == EACCES || errno == EAGAIN))
        fail("out=%s: another training is writing these files\nhint: another out=, such as out=%s_2", words[OUT].value,
             words[OUT].value);
    atexit(leave_place);
#endif
}

/* Says before a training what could not be written after it: no such directory, a full disk, a file that may not be changed. */
static void check_place(void)
{
    static const char *const suffix[] = {".check", ".roln",       "_weights.h",   "_errors.csv",
                                         ".svg",   "_motion.svg", "_report.html", "_limits.h", "_next.csv"};
    static const char *const elsewhere = "out= names another place, which must be there; it needs room for the checkpoint";
    FILE *f = fopen(name_of(".part").text, "wb");
    int good = f != NULL, why;
    size_t i;
    if (f) good = fwrite(&s, sizeof s, 1, f) == 1;
    if (f) good = fclose(f) == 0 && good;
    why = errno;
    remove(name_of(".part").text);
    if (!good) fail("cannot write %s: %s\nhint: %s", name_of(".part").text, strerror(why), elsewhere);
    for (i = 0; i < sizeof suffix / sizeof *suffix; i++) {
        const file_name p = name_of(suffix[i]);
        if (!(f = fopen(p.text, "rb"))) continue;
        fclose(f);
        if (!(f = fopen(p.text, "r+b"))) fail("cannot write %s: %s\nhint: %s", p.text, strerror(errno), elsewhere);
        fclose(f);
    }
}

/* Begins a header of weights that are no trained model, or are not yet judged. */
#define MARK "/* train.c: "

#include "held.h"
#include "report.h"
#include "baseline.h"
#include "delay.h"
#include "fitted.h"
#include "smoother.h"
#include "spread.h"
#include "page.h"

/* ---- 5 chart ---- */

#if ROLN_CHARTED
/* A training that cannot begin. */
static void give_up(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    end_with(LOST, format, list);
    va_end(list);
}
#endif

/* The encoder on 4,000 samples, until the residual falls by less than 1 % in 20 steps; then the decoder on all. */
static void fit_chart(void)
{
#if ROLN_CHARTED
    enum { SOME = 4000 };
    static M(refinement) turn;
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
        if (k > 1 && agreed(halted || left() < set("seconds") / 2)) break; /* the rest is for the networks */
        if (k % 20 == 0) before = residual;
        if (due()) printf("chart: step %d, the decoder leaves %.3g %% of q, %.0f s\n", steps, 100 * (double)residual, seconds());
        fflush(stdout);
        st = M(chart_refine)(&s.p, &b, &turn, &residual);
        steps += st == ROLN_OK;
    }
    if (st != ROLN_OK && st != ROLN_E_NO_CONVERGENCE)
        give_up("chart: %s\nhint: leave columns out that do not move, or record more motion", roln_status_text(st));
    st = M(chart_add)(&s.p, count, d.q, &sums, &scratch.chart_add);
    if (st == ROLN_OK) st = add_spread_chart(&sums, &scratch.chart_add);
    if (st == ROLN_OK) st = M(chart_solve)(&s.p, &sums, ROLN_CHART_RIDGE, &residual, &scratch.chart_solve);
    if (st != ROLN_OK) give_up("chart: %s\nhint: a lower degree, or more recordings", roln_status_text(st));
    printf("chart: the decoder leaves %.3g %% of q, after %d steps of the encoder, %.0f s\n", 100 * (double)residual, steps,
           seconds());
#endif
}

/* ---- 6 Gauss-Newton ---- */

typedef struct {
    const pool *samples, *windows;
    const M(params) *p; /* where */
    int again;          /* there the step has come to: residuals alone */
    int exact;          /* the data have no noise, so no residual is an outlier */
    int start[ROWS], length[ROWS], of_windows[PARTS];
    int *cut;                  /* [processes * threads + 1]: the first row of each thread of each process, in their order */
    char ran_away[THREADS][PARTS], overflowed[THREADS]; /* 1: a thread met such a window in a part; such a sample */
} rows;

/* Accelerations belong to the force at their instant, steps of windows to the mean force up to the next sample. */
static roln_batch batch_of(const pool *p, const int *start, int count)
{
    const motion *m = p->fetched ? &fetched : p->of;
    roln_batch b = {.q = m->q, .qd = m->qd, .start = start, .count = count};
    b.steps = p->steps, b.stride = p->stride;
    b.qdd = p->steps > 0 ? NULL : m->qdd;
    b.tau = acts() ? (p->steps > 0 ? m->tau : m->tau_mid) : NULL;
    return b;
}

/* The time that a row takes, in that of a sample, about (make scaling). */
static int row_time(const rows *f, int row)
{
    return row % PART < f->of_windows[row / PART] ? 3 * f->windows->steps : 1;
}

/* Cuts the first `count` rows into shares of equal time, one for each thread of each process. */
static void cut_rows(rows *f, int count)
{
    const int shares = processes * (int)set("threads");
    double all = 0, done = 0;
    int share_of = 0, k;
    if (!f->cut) f->cut = room((size_t)shares + 1, sizeof *f->cut);
    for (k = 0; k < count; k++)
        all += row_time(f, k);
    for (k = 0; k < count; k++) {
        for (; share_of < shares && done >= all * share_of / shares; share_of++)
            f->cut[share_of] = k;
        done += row_time(f, k);
    }
    for (; share_of <= shares; share_of++)
        f->cut[share_of] = count;
}

/* Fills the rows of a thread that are windows. */
static void fill_windows(void *ctx, int k, int thread)
{
    rows *f = ctx;
    const int *own = f->cut + process * (int)set("threads") + k;
    const roln_real weight = s.window_weight * s.window_weight;
    const roln_loss of_window = {.q_pred = weight, .qd_pred = weight / 10};
    int at, end, part;
    for (at = own[0]; at < own[1]; at = (part + 1) * PART) {
        roln_batch b;
        part = at / PART, end = part * PART + f->of_windows[part];
        end = end < own[1] ? end : own[1];
        if (at >= end) continue;
        b = batch_of(f->windows, f->start + at, end - at);
        if (M(rows)(f->p, &of_window, &b, (roln_real)(d.dt * b.stride), at, f->again, &residuals, &work[thread].rows) != ROLN_OK)
            f->ran_away[k][part] = 1;
    }
}

/* Fills the rows of a thread that are samples. */
static void fill_samples(void *ctx, int k, int thread)
{
    rows *f = ctx;
    const int *own = f->cut + process * (int)set("threads") + k;
    const roln_loss of_sample = {.qdd_pred = 1, .force = of_force};
    int at, from, end, part;
    for (at = own[0]; at < own[1]; at = (part + 1) * PART) {
        roln_batch b;
        part = at / PART, from = part * PART + f->of_windows[part], end = (part + 1) * PART;
        from = from > at ? from : at, end = end < own[1] ? end : own[1];
        if (from >= end) continue;
        b = batch_of(f->samples, f->start + from, end - from);
        if (M(rows)(f->p, &of_sample, &b, 1, from, f->again, &residuals, &work[thread].rows) != ROLN_OK) f->overflowed[k] = 1;
    }
}

/* Sends the rows that were filled to all processes; with `again` their residuals alone. */
static void gather_rows(const rows *f)
{
    const int threads = (int)set("threads");
    int *from, p;
    if (processes == 1) return;
    from = room((size_t)processes + 1, sizeof *from);
    for (p = 0; p <= processes; p++)
        from[p] = f->cut[p * threads];
    gather(f->again ? residuals.next : residuals.r, sizeof *residuals.r, from);
    if (!f->again) gather(residuals.J, M(newton_size) * sizeof *residuals.J, from);
    free(from);
}

/* Fills the rows of the first parts. If a window of a part runs away, all rows of that part become samples. Returns 0 if a sample
   overflows. */
static int fill(rows *f, int parts)
{
    const int threads = (int)set("threads");
    double away[PARTS] = {0};
    int overflowed = 0, k, t;
    memset(f->ran_away, 0, sizeof f->ran_away), memset(f->overflowed, 0, sizeof f->overflowed);
    cut_rows(f, parts * PART);
    share(threads, fill_windows, f);
    for (t = 0; t < threads; t++)
        for (k = 0; k < parts; k++)
            away[k] = fmax(away[k], f->ran_away[t][k]);
    if (s.window_weight > 0) largest(parts, away);
    for (k = 0; k < parts && !f->again; k++)
        if (away[k] > 0) f->of_windows[k] = 0;
    share(threads, fill_samples, f);
    for (t = 0; t < threads; t++)
        overflowed |= f->overflowed[t];
    gather_rows(f);
    return !agreed(overflowed);
}

/* Samples all over the recordings, 4,000 at most. */
static pool some_samples(void)
{
    pool some = pool_of(0, 1, 0);
    const int count = some.count < 4000 ? some.count : 4000;
    int k;
    for (k = 0; k < count; k++)
        some.start[k] = some.start[(int)((double)k * some.count / count)];
    some.count = count;
    return some;
}

/* Rows divide each force by its deviation, and all forces together count `part` times what accelerations do. */
static void weigh_forces(double part)
{
    pool some = some_samples();
    const roln_batch b = batch_of(&some, some.start, some.count);
    roln_loss var;
    of_force = 0;
    if (b.tau && part > 0 && M(variance)(&s.p, &b, &var, &work[0].variance) == ROLN_OK &&
        M(force_variance)(&s.p, &b, residuals.force_variance, &work[0].force_variance) == ROLN_OK)
        of_force = (roln_real)part * var.qdd / (roln_real)M(n);
    pool_free(&some);
}

/* Fills all rows with fresh samples and, in each part, `of_windows` windows. Returns 0 if a sample overflows. */
static int draw(rows *f, int of_windows)
{
    int k;
    f->p = &s.p, f->again = 0;
    residuals.seed = roln_rand(&s.seed);
    for (k = 0; k < PARTS * PART; k++) {
        const pool *p = k % PART < of_windows ? f->windows : f->samples;
        f->start[k] = drawn_from(p, &s.seed), f->length[k] = p == f->windows ? p->steps * p->stride + 1 : 1;
        f->of_windows[k / PART] = of_windows;
    }
    if (f->samples->fetched) fetch(PARTS * PART, f->start, f->length);
    return fill(f, PARTS);
}

/* The windows' weight: one row in twenty is a window, and three times as large as the other rows are. Parts in which one ran away
   do not count; if these are more than half, the model is not yet good enough for windows. */
static void weigh_windows(rows *f)
{
    double of_window = 0, of_sample = 0;
    int drawn, good = 0, k;
    s.window_weight = 1;
    drawn = draw(f, WINDOWS);
    s.window_weight = 0;
    if (!drawn) return;
    for (k = 0; k < PARTS * PART; k++)
        if (f->of_windows[k / PART] > 0) *(k % PART < WINDOWS ? &of_window : &of_sample) += fabs((double)residuals.r[k]);
    for (k = 0; k < PARTS; k++)
        good += f->of_windows[k] > 0;
    if (2 * good < PARTS) return;
    if (!(of_window > 0 && isfinite(of_window) && isfinite(of_sample))) return;
    s.windowed = 1;
    s.window_weight = (roln_real)(3 * of_sample / (PART - WINDOWS) * WINDOWS / of_window);
    printf("from here on windows of %d steps of %g s\n", f->windows->steps, d.dt * f->windows->stride);
}

/* The first row of share k of the sums. Each thread of each process has a share. The sums are a triangle, and shares take equal
   times. */
static int band_at(int k)
{
    return (int)(M(newton_side) * sqrt(k / (processes * set("threads"))));
}

static void sum(void *ctx, int k, int thread)
{
    static roln_real scratch[THREADS][ROLN_SYM_WORK];
    const int band = process * (int)set("threads") + k;
    M(newton_normal_equations)(ctx, PARTS * PART, band_at(band), band_at(band + 1), &residuals, &s.newton, scratch[thread]);
}

/* Sends the sums of each process to all others, without the half above the diagonal. */
static void gather_sums(void)
{
    enum { side = M(newton_side) };
    static roln_real *packed; /* [side (side + 1) / 2] */
    const int threads = (int)set("threads"), own = band_at(process * threads), others = band_at((process + 1) * threads);
    int *from, p, i;
    if (processes == 1) return;
    if (!packed) packed = room((size_t)side * (side + 1) / 2, sizeof *packed);
    from = room((size_t)processes + 1, sizeof *from);
    for (p = 0; p <= processes; p++) {
        const int row = band_at(p * threads);
        from[p] = (int)((int64_t)row * (row + 1) / 2);
    }
    for (i = own; i < others; i++)
        memcpy(packed + (size_t)i * ((size_t)i + 1) / 2, s.newton.S + (size_t)i * (side + 1), ((size_t)i + 1) * sizeof *packed);
    gather(packed, sizeof *packed, from);
    for (i = 0; i < side; i++)
        if (i < own || i >= others)
            memcpy(s.newton.S + (size_t)i * (side + 1), packed + (size_t)i * ((size_t)i + 1) / 2, ((size_t)i + 1) * sizeof *packed);
    free(from);
}

static double granted; /* seconds that were left when the stage began, or went on */

/* Networks that began at the regression are good enough at once. */
static int windows_from(void)
{
    return s.begun_there ? 2 : WINDOWS_FROM;
}

/* Where Gauss-Newton begins: far from a minimum, or so near to one that few rows lead away from it. */
static roln_newton fresh(void)
{
    roln_newton state = ROLN_NEWTON_START;
    if (s.begun_there) state.lambda = 1;
    return state;
}

/* Windows begin at step windows_from, or when half of the time is over that seconds= leaves the stage. */
static int windows_begin(void)
{
    return s.step >= windows_from() || (set("seconds") > 0 && agreed(left() < granted / 2));
}

/* 1.3 times the largest |z| of what is trained with, at least 1.3; z that is no angle. */
static roln_real reach_of_data(void)
{
    static M(fit_range_work) scratch;
    static M(params) p;
    roln_real most = 1;
    int i;
    p = s.p;
    if (find_spread_range() || M(fit_range)(&p, d.first[train], d.q, d.qd, &scratch) != ROLN_OK) return ROLN_C(1.3);
    widen_range(&p);
    for (i = 0; i < (int)M(n); i++)
        if (!roln_lnn_angle(&M(model).lnn, i)) most = ROLN_MAX(most, ROLN_MAX(p.z_max[i], -p.z_min[i]));
    return ROLN_C(1.3) * most;
}

/* One step. If it is refused in spite of more and more damping, the next rows may know better. Returns why there was none, NULL: it
   is done. */
static const char *newton_step(rows *f)
{
    enum { JUDGES = 4, TRIES = 6, DRAWS = 8 };
    static roln_real ridge[M(newton_size)];
    const roln_real rate = s.gentle ? ROLN_C(0.3) : 1;
    roln_newton_opt opt = ROLN_NEWTON_OPT;
    roln_real damping;
    roln_status st;
    int tries, k;
    if (s.gentle && s.newton.state.lambda < ROLN_C(0.1)) s.newton.state.lambda = ROLN_C(0.1);
    damping = s.newton.state.lambda, opt.memory = s.memory, opt.rate = rate;
    if (f->exact) opt.cap = 0;
    if (s.window_weight == 0 && f->windows->count > 0 && windows_begin()) weigh_windows(f);
    for (tries = 0; tries < DRAWS; tries++) { /* rows that overflow may be few */
        if (!draw(f, s.window_weight > 0 ? WINDOWS : 0)) continue;
        if (POLYNOMIALS && !(set("torque") > 0) &&
            M(scale_row)(&s.p, s.scale, HOLD, PARTS * PART - 1, &residuals) != ROLN_OK)
            return "the mass matrix has become 0";
        if (M(newton_rows)(&s.p, &opt, PARTS * PART, &residuals, &s.newton) == ROLN_OK) break;
    }
    if (tries == DRAWS)
        return "residuals of training samples overflow; possible cause: a wild sample, force= or a unit far too large";
    if (POLYNOMIALS && !(s.reach > 0)) s.reach = reach_of_data();
    if (POLYNOMIALS) M(newton_ridge)((roln_real)set("ridge") * s.newton.state.loss, s.reach, ridge), opt.ridge = ridge;
    share((int)set("threads"), sum, &opt), gather_sums();
    f->p = &s.newton.next, f->again = 1;
    for (tries = 0; tries < TRIES; tries++) {
        st = M(newton_step)(&s.p, &opt, PARTS * PART, &residuals, &s.newton);
        if (st != ROLN_OK) return "the normal equations have no solution that is finite";
        (void)fill(f, JUDGES);
        if (M(newton_accept)(&s.p, PARTS * PART, JUDGES * PART, &residuals, &s.newton)) break;
    }
    if (tries == TRIES) roln_newton_give_up(damping, &s.newton.state);
    for (k = 0; k < M(newton_size); k++)
        s.mean[k] += (s.p.theta[M(newton_from) + k] - s.mean[k]) / (roln_real)(s.step < 8 ? s.step + 1 : 8);
    return NULL;
}

/* From where start.h has left the networks: Gauss-Newton on torques that the regression computes, which have no noise, until those
   of the networks differ by at most half of what the regression itself leaves of the recorded ones. It takes at most a tenth of
   seconds=. Then s is as it was, but for the weights. */
static void refine_start(void)
{
    enum { MOST = 60, PATIENCE = 15 };
    static rows f;
    static M(params) best;
    const regression_source x = source_of(&d, 0, train);
    const double goal = baseline_noise() / 2, from = now(), most = set("seconds") > 0 ? set("seconds") / 10 : HUGE_VAL;
    motion m = start_samples(&baseline, &x);
    pool samples = {.of = &m, .count = m.samples, .near = m.samples, .stride = 1}, none = {.of = &m};
    const uint64_t seed = s.seed;
    double least = HUGE_VAL;
    int at = 0;
    samples.start = room((size_t)m.samples, sizeof *samples.start);
    for (s.step = 0; s.step < m.samples; s.step++)
        samples.start[s.step] = s.step;
    f.samples = &samples, f.windows = &none, f.exact = 1;
    weigh_forces(1);
    s.newton.state = (roln_newton)ROLN_NEWTON_START, s.memory = 8;
    for (s.step = 0;; s.step++) {
        const double off = torque_error(&s.p, &m, 0, 1);
        if (off < least) least = off, best = s.p, at = s.step;
        if (least <= goal || s.step == MOST || s.step == at + PATIENCE || agreed(halted || now() - from > most)) break;
        if (newton_step(&f)) break;
        progress("networks to the regression", (double)s.step / MOST);
    }
    printf("torques of the networks are off by %s %% from those of the regression, after %d steps, %.1f s\n",
           in_percent(least).text, at, now() - from);
    fflush(stdout);
    s.p = best, s.step = 0, s.seed = seed;
    memset(&s.newton, 0, sizeof s.newton), memset(s.mean, 0, sizeof s.mean);
    start_free(&m), pool_free(&samples);
}

/* ---- 7 Adam ---- */

enum { SLICES = 4, BATCH = 64 };

typedef struct {
    const pool *samples;
    int start[BATCH], length[BATCH], refused; /* updates in a row */
    M(gradient) g[SLICES];
    roln_status status[SLICES];
} descent;

static void slice(void *ctx, int own, int thread)
{
    static const roln_loss of_layers = {.q = 2, .qd = 1},
                           of_all = {.q = 2, .qd = 1, .qdd = ROLN_C(0.1), .zdd = ROLN_C(0.1), .qdd_pred = ROLN_C(0.1)};
    descent *a = ctx;
    const int k = cut_at(SLICES, process) + own;
    const roln_batch b = batch_of(a->samples, a->start + k * (BATCH / SLICES), BATCH / SLICES);
    memset(&a->g[k], 0, sizeof a->g[k]);
    a->status[k] = s.stage == ADAM ? M(grad_acc)(&s.p, &of_all, &b, &a->g[k], &work[thread].grad_acc)
                                   : M(grad)(&s.p, &of_layers, &b, 1, &a->g[k], &work[thread].grad);
}

/* One of `updates` updates. One that is refused changes nothing. Returns why none is taken any more, or NULL. */
static const char *adam_step(descent *a, int updates)
{
    const roln_real rate = roln_schedule((uint32_t)s.step, 100, (uint32_t)updates, ROLN_C(1e-3));
    const roln_opt opt = ROLN_OPT(rate * (roln_real)set("lr_ae"), rate * (roln_real)(s.stage == ADAM ? set("lr_net") : 0));
    enum { MOST = 1000 };
    int k, i;
    if (a->refused == MOST)
        return "1000 updates in a row were refused; possible cause: lr_ae= or lr_net= far too large, a wild sample";
    a->refused++;
    for (i = 0; i < BATCH; i++)
        a->start[i] = drawn_from(a->samples, &s.seed), a->length[i] = 1;
    if (a->samples->fetched) fetch(BATCH, a->start, a->length);
    share(cut_at(SLICES, process + 1) - cut_at(SLICES, process), slice, a);
    gather_cuts(a->g, sizeof *a->g, SLICES), gather_cuts(a->status, sizeof *a->status, SLICES);
    for (k = 0; k < SLICES; k++) {
        if (a->status[k] != ROLN_OK) return NULL;
        for (i = 0; i < M(theta_size) && k > 0; i++)
            a->g[0].theta[i] += a->g[k].theta[i];
        if (k > 0) a->g[0].windows += a->g[k].windows;
    }
    if (M(update)(&s.p, &opt, &s.optimiser, &a->g[0], &work[0].update) == ROLN_OK) a->refused = 0;
    return NULL;
}

/* ---- 8 checkpoint ---- */

/* What a checkpoint belongs to. */
typedef struct {
    uint64_t config, data, words, state; /* checksums; words: FROM .. IGNORE */
    double dt;
    size_t size;
    int samples, trajectories;
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
    static const char *const may_change = "seconds steps threads resume next tick false_alarms";
    origin o;
    int i;
    memset(&o, 0, sizeof o);
    none.slope = M(model).ae.slope, none.eigenvalue_floor = M(model).lnn.eigenvalue_floor;
    M(pack)(&none, bytes);
    if (data == 0) data = checksum_of(d.q, d.N) ^ 3 * checksum_of(d.qd, d.N) ^ 5 * checksum_of(d.tau, d.forces);
    for (i = 0; i < d.trajectories; i++) /* where recordings begin */
        o.data = 3 * o.data + (uint64_t)d.first[i];
    o.data = 3 * o.data + (uint64_t)train;
    o.config = roln_fnv((int)sizeof bytes, bytes, ROLN_FNV), o.data ^= data ^ 7 * scattered.sum, o.dt = d.dt;
    o.words = ROLN_FNV;
    for (i = FROM; i <= IGNORE; i++) {
        const char *text = words[i].value ? words[i].value : "";
        o.words = roln_fnv((int)strlen(text) + 1, (const unsigned char *)text, o.words);
    }
    o.size = sizeof s, o.samples = d.samples, o.trajectories = d.trajectories;
    for (i = 0; i < SETTINGS; i++)
        o.value[i] = strstr(may_change, settings[i].key) ? 0 : settings[i].value;
    return o;
}

typedef char state_fits_an_int[(uint64_t)sizeof s <= INT_MAX ? 1 : -1];

static uint64_t checksum_of_state(void)
{
    return roln_fnv((int)sizeof s, (const unsigned char *)&s, ROLN_FNV);
}

/* OUTsuffix becomes OUTsuffix.old. Zero if there is none. */
static int keep(const char *suffix)
{
    file_name old = name_of(suffix);
    strcat(old.text, ".old");
#ifdef _WIN32
    remove(old.text);
#endif
    return rename(name_of(suffix).text, old.text) == 0;
}

static int ours; /* nonzero: OUT.check is of this training */

/* If it cannot be written the one before is left, and training goes on. The first one of a training that does not go on from
   OUT.check keeps that as OUT.check.old. */
static void checkpoint(void)
{
    origin o = origin_of();
    FILE *f = process == 0 ? file(".part", "wb") : NULL;
    if (!f) return;
    if (!ours && keep(".check"))
        printf("%s.check, of another training, is kept as %s.check.old\n", words[OUT].value, words[OUT].value);
    ours = 1;
    s.seconds = seconds(), began = now();
    o.state = checksum_of_state();
    if (fwrite(&o, sizeof o, 1, f) == 1) fwrite(&s, sizeof s, 1, f);
    put_in_place(f, ".check");
}

/* Refuses processes whose recordings, settings or models differ: they would share their rows all the same. */
static void check_alike_everywhere(void)
{
    const origin o = origin_of();
    uint64_t mine = roln_fnv((int)sizeof o, (const unsigned char *)&o, ROLN_FNV), first;
    int i;
    for (i = 0; i < SETTINGS; i++) /* those that a checkpoint lets change, too */
        mine = roln_fnv((int)sizeof settings[i].value, (const unsigned char *)&settings[i].value, mine);
    first = mine;
    hand_out(0, &first, sizeof first);
    apart = 1;
    if (first != mine)
        fail("process %d has other recordings, settings or another config than process 0\nhint: the same program, files and words "
             "for all", process);
    apart = 0;
}

/* Reads the state from the checkpoint. */
static void read_checkpoint(void)
{
    static const char *const anew = "leave --resume out, and begin anew with from=OUT.roln, if that is there";
    const origin o = origin_of();
    origin was;
    uint64_t state;
    FILE *f;
    if (!(f = fopen(name_of(".check").text, "rb")))
        fail("there is no %s.check to go on from\nhint: out= as in the training that it belongs to, or leave --resume out; "
             "OUT.check.old belongs to the training before",
             words[OUT].value);
    if (fread(&was, sizeof was, 1, f) != 1) fail("%s.check is cut off\nhint: %s", words[OUT].value, anew);
    state = was.state, was.state = 0;
    if (memcmp(&was, &o, sizeof o) != 0)
        fail("%s.check is of other data, other settings or another config\nhint: take those again, or leave --resume out: "
             "OUT.check is kept "
             "as OUT.check.old",
             words[OUT].value);
    if (fread(&s, sizeof s, 1, f) != 1) fail("%s.check is cut off\nhint: %s", words[OUT].value, anew);
    if (checksum_of_state() != state || getc(f) != EOF) fail("%s.check is damaged\nhint: %s", words[OUT].value, anew);
    fclose(f);
    ours = 1;
}

/* Goes on from the checkpoint, which process 0 reads. Zero without --resume. */
static int resume(void)
{
    if (!(set("resume") > 0)) return 0;
    if (process == 0) read_checkpoint();
    hand_out(0, &s, sizeof s);
    begun = process == 0;
    printf("on from step %d of: %s\n", s.step, stage_names[s.stage]);
    return 1;
}

#include "next.h"

/* ---- 9 stages ---- */

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

/* The first steps from the regression lead away from it: noise of the torques. Back to it, with small steps. */
static void step_gently(void)
{
    s.p = s.best, s.gentle = 1, s.memory = 40, s.window_weight = 0, s.since = s.step;
    memset(&s.newton, 0, sizeof s.newton);
    s.newton.state = fresh();
    memcpy(s.mean, s.p.theta + M(newton_from), sizeof s.mean);
    printf("back to the regression, with small steps: the recorded torques are noisy\n");
}

/* Horizon of a look, in samples: look= seconds, at most half of the median held-out trajectory, so that at least half of them are
   long enough, and a short one shortens nothing. */
static int farthest(void)
{
    const int count = d.trajectories - train, stride = stride_of(&d, 0.005);
    double *length = room((size_t)count, sizeof *length), most;
    int k;
    for (k = 0; k < count; k++)
        length[k] = d.first[train + k + 1] - d.first[train + k];
    qsort(length, (size_t)count, sizeof *length, smaller);
    most = floor(length[count / 2] / 2) * d.dt;
    free(length);
    return s.stage == LAYERS ? 0 : (int)fmax(1, fmin(set("look"), most) / d.dt / stride + 0.5) * stride;
}

/* How the weights, averaged where that makes sense, predict held-out trajectories 25 ms and `look` seconds ahead; of layers alone,
   how they reconstruct them; with torque=1, how far off their torques are. Keeps the best: those with the least product of the
   typical error and that of torques, where torques that are off by less than 10 % count as if they were off by 10 %. */
static void look(void)
{
    const int stride = stride_of(&d, 0.005), far = farthest(), near = (int)fmin(stride_of(&d, 0.025) / stride * stride, far);
    const int held = d.trajectories - train;
    score *scores = room((size_t)held, sizeof *scores);
    int every = stride_of(&d, 0.1) * (s.thin > 0 ? s.thin : 1);
    M(params) p = s.p;
    double torque = 0, product;
    error e[2];
    if (s.stage == NEWTON && FLAT && s.step > 0) memcpy(p.theta + M(newton_from), s.mean, sizeof s.mean);
    bar.what = "look", bar.done = 0, bar.part = near / fmax(near + far, 1);
    e[0] = errors(&d, &p, train, held, near, stride, every, scores);
    for (; s.thin == 0 && set("seconds") > 0 && every < d.samples; every *= 2) /* a look takes a twentieth of seconds= at most */
        if (agreed(price() * steps_to(&d, train, d.trajectories, far, stride, every) < set("seconds") / 20)) break;
    if (s.thin == 0) s.thin = every / stride_of(&d, 0.1);
    bar.done = bar.part, bar.part = 1 - bar.part;
    e[1] = errors(&d, &p, train, held, far, stride, every, scores);
    free(scores);
    if (set("torque") > 0 && s.stage != LAYERS) torque = torque_error(&p, &d, train, d.trajectories);
    s.ahead = far * d.dt;
    product = e[1].typical * fmax(torque, 0.1);
    hand_out(0, &product, sizeof product); /* libraries of other machines may round otherwise */
    if (s.step == 0 || product < s.best_score)
        s.best_score = product, s.best_error = e[1].typical, s.best = p, s.best_step = s.since = s.step, s.falls = 0;
    printf("%7d  E_q(%.3g ms) %7s %%  E_q(%.3g s) %7s +- %s %%, typical %s %%", s.step, 1e3 * near * d.dt, in_percent(e[0].q).text,
           far * d.dt, in_percent(e[1].q).text, in_percent(e[1].q_error).text, in_percent(e[1].typical).text);
    if (s.stage == NEWTON)
        printf("  residual %.2e  damping %.0e", sqrt((double)s.newton.state.loss / ROWS), (double)s.newton.state.lambda);
    if (torque > 0) printf("  torques %.3g %%", 100 * torque);
    printf("%s  %.0f s\n", remarks_on(&e[1], held).text, seconds());
    fflush(stdout);
    if (s.points < POINTS) s.point[s.points][0] = seconds(), s.point[s.points][1] = e[0].q, s.point[s.points++][2] = e[1].q;
    if (process == 0) draw_curve(near * d.dt, far * d.dt);
    if (s.stage == NEWTON && s.begun_there && !s.gentle && s.best_step == 0 && product > 1.05 * s.best_score) step_gently();
    else if (s.stage == NEWTON && s.step > windows_from() && s.memory > 2 &&
        (product > 2 * s.best_score || s.step >= s.since + patience()))
        turn_back();
}

/* Updates of a stage; of Gauss-Newton 1: it ends by itself. */
static int updates_of(int stage)
{
    const int adam = is_adam(), layers = LAYERED;
    return stage == LAYERS ? layers * (int)set("ae") : stage == ADAM ? adam * (int)set("acc") : !adam;
}

static double slowest; /* seconds of the slowest step of this run */

/* Seconds that the end of a training takes: a last step and look, the tables, the picture. */
static double reserve(void)
{
    const int far = s.ahead > 0 ? (int)(s.ahead / d.dt + 0.5) : 1, every = stride_of(&d, 0.1) * (s.thin > 0 ? s.thin : 1);
    const double looks = 2 * steps_to(&d, train, d.trajectories, far, stride_of(&d, 0.005), every);
    double tables = steps_of_table(&d, train, d.trajectories, stride_of(&d, 0.025));
    if (words[TEST].value) tables += steps_of_table(&unseen, 0, unseen.trajectories, stride_of(&unseen, 0.025));
    return 1.3 * (slowest + price() * looks + fmin(price() * tables, set("seconds") / 10)) + reserve_of_next();
}

/* Nonzero if the run has to end now: why stands in `ended`. */
static int halting(void)
{
    const int sig = agreed((int)halted); /* one that comes later counts at the next step, there for all */
    if (sig) snprintf(ended, sizeof ended, "signal %d", sig), halted = sig;
    else if (set("seconds") > 0 && agreed(left() < reserve())) snprintf(ended, sizeof ended, "seconds=%g", set("seconds"));
    return ended[0] != 0;
}

/* Gauss-Newton ends when a short memory gains nothing either. */
static int done(int updates)
{
    const int steps = s.stage == NEWTON ? (int)set("steps") : updates;
    if (steps > 0 || s.stage != NEWTON) return s.step >= steps;
    return s.memory <= 2 && s.step >= s.since + patience();
}

/* There was no step: Gauss-Newton begins anew from the best weights, three times without a gain; else the training ends. Either
   way a checkpoint goes on from the best weights, with other rows. */
static void fall_back(const char *why)
{
    s.p = s.best, s.window_weight = 0;
    memset(&s.newton, 0, sizeof s.newton);
    s.newton.state = fresh();
    if (s.stage != NEWTON) memset(&s.optimiser, 0, sizeof s.optimiser);
    memcpy(s.mean, s.p.theta + M(newton_from), sizeof s.mean);
    if (s.stage == NEWTON && s.falls++ < 3) printf("step %d: %s; back to step %d\n", s.step, why, s.best_step);
    else snprintf(ended, sizeof ended, "a failure (%s)", why), s.falls = 0;
    fflush(stdout);
}

/* Says which recordings are too short: for a sample with a sample on each side, for a window. */
static void tell_short(const pool *longer)
{
    const int reach = longer->steps * longer->stride;
    int few = 0, brief = 0, k;
    for (k = 0; k < d.trajectories; k++) {
        const int samples = d.first[k + 1] - d.first[k];
        few += samples < 3, brief += samples >= 3 && samples < reach + 2 && k < train && s.stage == NEWTON;
    }
    for (k = 0; k < scattered.recordings; k++) {
        const int samples = scattered.first[k + 1] - scattered.first[k];
        few += samples < 3, brief += samples >= 3 && samples < reach + 2 && s.stage == NEWTON;
    }
    if (few > 0) printf("%d recordings of fewer than 3 samples: not used\n", few);
    if (brief > 0) printf("%d recordings shorter than a window of %g s: not used for windows\n", brief, reach * d.dt);
}

/* One stage, from where it stands to its end: then p is what predicted best. Looks at Gauss-Newton come at growing intervals. If
   the run ends before the stage does, OUT.check goes on from there, with the bits of a run that was not ended; else from the end,
   behind its last look. */
static void run(void)
{
    static rows f;
    static descent a;
    const int updates = updates_of(s.stage), stride = stride_of(&d, 0.02), most = (int)(set("window") / d.dt / stride + 0.5);
    int at = s.step;
    pool samples = pool_of(0, 1, 1), longer = pool_of(most < M(horizon) ? most : M(horizon), stride, 1);
    if (longer.steps == 0) longer.count = 0;
    f.samples = a.samples = &samples, f.windows = &longer;
    if (samples.count < 1) fail("no recording to train with has 3 samples\nhint: record longer recordings");
    last = s.stage, window_count = longer.count, granted = left();
    if (s.stage == NEWTON) weigh_forces(set("force"));
    if (s.next == 0) {
        s.newton.state = fresh(), s.memory = 8, s.scale = M(scale_of)(&s.p);
        printf("%s\n", stage_names[s.stage]), tell_short(&longer);
    }
    while (s.next == 0 || !(done(updates) || halting())) {
        const char *why;
        double from_now;
        if (s.step == s.next) {
            at = s.step;
            s.next += s.stage == NEWTON ? 4 + s.next / 8 : updates / 20 + 1;
            look();
            begun = process == 0;
            checkpoint();
        }
        progress("to the next look", (double)(s.step - at) / (s.next - at));
        from_now = now();
        why = s.stage == NEWTON ? newton_step(&f) : adam_step(&a, updates);
        slowest = fmax(slowest, now() - from_now);
        s.step++;
        if (why) fall_back(why);
    }
    if (ended[0]) checkpoint();
    else if (s.stage == NEWTON && set("steps") > 0) snprintf(limit, sizeof limit, "steps=%g", set("steps"));
    if (agreed(!halted || price() * steps_to(&d, train, d.trajectories, (int)(s.ahead / d.dt), 1, stride_of(&d, 0.1)) < left()))
        look();
    if (!ended[0]) checkpoint();
    reached = s.step;
    s.p = s.best, s.step = s.next = 0;
    pool_free(&samples), pool_free(&longer);
}

/* ---- 10 weights ---- */

static void put_file(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

/* Nonzero if OUTsuffix, a header of weights, is there and says of itself that it is no trained model, or not yet judged. */
static int marked(const char *suffix)
{
    char line[sizeof MARK] = "";
    FILE *f = fopen(name_of(suffix).text, "rb");
    if (!f) return 0;
    line[fread(line, 1, sizeof line - 1, f)] = 0;
    fclose(f);
    return strcmp(line, MARK) == 0;
}

/* Weights and limits of an earlier training get .old behind their names. If the kept ones were judged good, and those that are
   there were not, they stay. Weights that this training goes on from are not kept. Returns the number of files kept. */
static int keep_old(void)
{
    const int better = is_file(name_of("_weights.h.old").text) && !marked("_weights.h.old");
    if (marked("_weights.h") && (set("resume") > 0 || better)) return 0;
    return keep(".roln") + keep("_weights.h") + keep("_limits.h");
}

/* OUT.roln and OUT_weights.h; mark: what the header says of the weights, NULL: nothing. Zero if they cannot be written. */
static int write_weights(const char *mark)
{
    static unsigned char bytes[M(packed_size)];
    static M(fit_range_work) scratch;
    static M(params) p;
    FILE *f;
    int good;
    s.p.dt = (roln_real)(d.dt * stride_of(&d, 0.005));
    if (M(fit_range)(&s.p, d.first[train], d.q, d.qd, &scratch) != ROLN_OK)
        object("the range of z overflows; possible cause: a wild sample");
    widen_range(&s.p);
    p = s.p, p.scale.m *= (roln_real)torque_scale;
    M(pack)(&p, bytes);
    if (!(f = file(".part", "wb"))) return 0;
    fwrite(bytes, 1, sizeof bytes, f);
    good = put_in_place(f, ".roln");
    if (!(f = file(".part", "w"))) return 0;
    if (mark) fprintf(f, MARK "%s */\n", mark);
    if (M(write)(&p, put_file, f) != ROLN_OK) object("weights that are no C constants");
    if (strcmp(words[DELAY].value, "0") != 0)
        fprintf(f, "\n/* s from the stamp of a torque to its effect, in the recordings (docs/control.md, \"Delay\") */\n"
                   "#define %s_DELAY ROLN_C(%.6g)\n", STRING(MODEL), delay_found);
    weights_sum = roln_fnv((int)sizeof bytes, bytes, ROLN_FNV) & 0xffffffff;
    fputc('\n', f), put_sum(f, "WEIGHTS", "LIMITS");
    return put_in_place(f, "_weights.h") && good;
}

/* Behind exit() in the middle of a training, out of memory, say: the weights that were best so far. */
static void rescue(void)
{
    const int step = s.step;
    if (!begun) return;
    begun = 0;
    s.p = s.best;
    keep_old();
    fflush(stdout);
    if (!write_weights("not judged: the program ended in the middle of a training")) return;
    fflush(stdout);
    fprintf(stderr, "no trained model: the training ended at step %d, for the reason above; weights of step %d are written\n", step,
            s.best_step);
    leave_place();
    end_at_once(UNTRAINED);
}

/* Doubts of the training itself. That of its errors: `judge`. */
static void judge_training(void)
{
    if (last < NEWTON) object("before any step of the networks");
    else if (s.best_step == 0 && !s.begun_there) object("no step predicts better than the weights before it");
    if (last == NEWTON && window_count > 0 && !s.windowed)
        object(reached > windows_from() ? "from step %d on windows ran away"
                                       : "before windows, which begin at step %d or at half of seconds=", windows_from());
}

/* ---- 11 main ---- */

static void to_unit_of_tau(motion *m, double factor)
{
    int i;
    for (i = 0; i < m->samples * m->forces; i++)
        m->tau[i] *= (roln_real)factor, m->tau_mid[i] *= (roln_real)factor;
}

/* The unit of inertia, from the regression, or from the torques of some samples: of a machine in Nm that weighs grams, or one of
   tons. */
static void fit_inertia(void)
{
    pool some = some_samples();
    const roln_batch b = batch_of(&some, some.start, some.count);
    if (set("inertia") > 0) s.p.scale.m = (roln_real)(set("inertia") / torque_scale);
    else if (fitted) start_scale(&baseline, &s.p);
    else if (M(fit_inertia)(&s.p, &b, &work[0].fit_inertia) != ROLN_OK)
        printf("warning: torque=1, but the torques do not change: M and V are known up to a factor\n");
    if (s.p.scale.m != 1) printf("unit of inertia: %.3g\n", torque_scale * (double)s.p.scale.m);
    pool_free(&some);
}

/* The POD, then the chart; or the packed weights that the user names. */
static void start(void)
{
    static M(start) scratch;
    static unsigned char bytes[M(packed_size) + 1]; /* of a longer file, too many */
    s.seed = (uint64_t)set("seed");
    if (M(init_pod)(&s.p, d.first[train], d.q, d.qd, s.qbar, &s.seed, &scratch.init_pod) != ROLN_OK)
        fail("no start from this data; possible cause: it does not move, or its numbers are too large\n"
             "hint: look at q1 .. q%d in %s",
             (int)M(N), d.path);
    if (words[FROM].value) {
        FILE *f = fopen(words[FROM].value, "rb");
        const roln_status st = f ? M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &s.p) : ROLN_OK;
        if (!f || ferror(f)) fail("cannot read %s: %s\nhint: from= is a .roln of this config", words[FROM].value, strerror(errno));
        if (st != ROLN_OK)
            fail("cannot start from %s: %s\nhint: from= is a .roln of this config", words[FROM].value,
                 st == ROLN_E_FORMAT                            ? "no .roln of this version"
                 : st == ROLN_E_LENGTH                          ? "it is cut off, or goes on behind its end"
                 : st == ROLN_E_CHECKSUM                        ? "it is damaged"
                 : st == ROLN_E_SHAPE || st == ROLN_E_PRECISION ? "it is of another config"
                                                                : "its numbers make no sense");
        fclose(f);
        s.p.scale.m /= (roln_real)torque_scale;
        leave_out();
    } else {
        fit_chart();
        leave_out();
        if (set("torque") > 0) fit_inertia();
        start_at_baseline();
        if (s.begun_there) refine_start();
    }
}

/* How far the training came, in a few lines. */
static void summary(void)
{
    if (ended[0]) printf("ended by %s at step %d\n", ended, reached);
    printf("wrote %s.roln and %s_weights.h after %.0f s: weights of step %d\n", words[OUT].value, words[OUT].value, seconds(),
           s.best_step);
    if (s.ahead > 0) /* there was a look */
        printf("held-out recordings are predicted with a typical E_q of %.3f %% after %.3g s\n", 100 * s.best_error, s.ahead);
    if (s.best_error < 1) return;
    object("held-out recordings are predicted no better than by the mean of q");
    printf("that is no better than the mean of q; possible cause: columns in another order, unit or sign; motion driven by more "
           "than tau%s; too few coordinates or recordings\n",
           set("torque") > 0 ? ", or tau at another time than it acts" : ", for torque=0");
}

/* The tables, which take about so many seconds, and what is as long to draw. */
static void tables(double most)
{
    const char *const altered = set("noise") > 0 || set("smooth") > 0 ? ", altered as above" : "";
    const int far = (int)(s.ahead / d.dt);
    char held[60];
    FILE *csv = file("_errors.csv", "w");
    snprintf(held, sizeof held, "held-out recordings%s", altered);
    printf("E_q, E_qd: errors over the rms of motion; +-: standard error; q + h qd: constant velocity, (does not count)\n");
    table_head(csv);
    table(held, "held out", &d, train, d.trajectories, words[TEST].value ? most / 2 : most, csv);
    tell_baseline();
    if (words[TEST].value) table(words[TEST].value, "test=", &unseen, 0, unseen.trajectories, most / 2, csv);
    if (csv) close_file(csv, "_errors.csv");
    to_unit_of_tau(&d, torque_scale), to_unit_of_tau(&unseen, torque_scale); /* from here on torques are as they were recorded */
    s.p.scale.m *= (roln_real)torque_scale, s.best.scale.m *= (roln_real)torque_scale, torque_scale = 1;
    if (set("torque") > 0) torques();
    if (price() * steps_to(&d, train, d.trajectories, far, 1, stride_of(&d, 0.1)) < left()) draw_motion();
}

/* The last line of a training that came to a model: the largest E_q of held-out recordings up to look=. */
static void tell_success(void)
{
    double most = 0, up_to = 0;
    int i;
    for (i = 0; i < kept_tables[0].rows; i++) {
        const double ms = kept_tables[0].row[i].ms, q = kept_tables[0].row[i].e.q;
        if (ms > 1001 * s.ahead || !isfinite(q)) continue;
        most = fmax(most, q), up_to = ms;
    }
    if (up_to > 0) printf("A model was trained: it predicts to %.3g %% (E_q) up to %.3g s\n", 100 * most, up_to / 1e3);
    else printf("A model was trained.\n");
}

/* Writes the weights, judges them by the tables, and writes the verdict into their header. Returns the exit code. */
static int report(void)
{
    const char *const by = ended[0] ? ended : limit;
    char text[sizeof objections + sizeof ended + 100], *c;
    int kept;
    judge_training();
    begun = 0, kept = keep_old();
    if (!write_weights("not judged: the table of errors was not finished"))
        fail("weights are not written, as said above%s\nhint: make room, then go on from %s.check with --resume",
             kept > 0 ? "; those that were there before end with .old" : "", words[OUT].value);
    summary();
    tables(0.7 * fmax(0, left() - reserve_of_next()));
    snprintf(text, sizeof text, "ended by %s at step %d: %s", by[0] ? by : "itself", reached, objections);
    for (c = text; *c; c++)
        if (*c == '*') *c = '.'; /* it goes into a comment */
    if (!write_weights(objections[0] ? text : NULL))
        fail("%s_weights.h has no verdict: it cannot be written again, as said above\nhint: make room, then --resume",
             words[OUT].value);
    fit_settings(), write_settings(objections[0] ? text : NULL), write_page(objections[0] ? text : NULL);
    write_next();
    if (kept > 0) printf("what was there before is kept: %s.roln.old, %s_weights.h.old ..\n", words[OUT].value, words[OUT].value);
    if (!objections[0]) tell_success();
    fflush(stdout);
    if (objections[0])
        fprintf(stderr, "no trained model: %s; weights of step %d are written%s\n", text, s.best_step,
                by[0] ? "; train on with --resume" : "");
    else if (unwritten) fprintf(stderr, "files that could not be written, as said above: %d; the weights are written\n", unwritten);
    return objections[0] ? UNTRAINED : unwritten ? WRONG : DONE;
}

/* Says what becomes of positions without velocities, and does it. */
static void smooth_positions(motion *m)
{
    const int half = (int)set("smooth");
    say("%s: %s, so q, qd, qdd smoothed over %d samples\n", m->path, m->has_qd ? "smooth=" : "no qd", 2 * half + 1);
    smooth(m, half);
    m->reach = fmax(m->reach, half * m->dt);
}

/* Three joints or more: hinges, by the units of the column map or of the file, that the networks see as numbers. No unit is known:
   they may be hinges. */
static void tell_hinges(void)
{
    unsigned hinges = M(angles);
    int unknown = 1, k;
    if (!JOINTS || (int)M(N) < 3 || (int)M(N) > ROLN_ANGLES_MAX) return;
    for (k = 0; k < d.count; k++) {
        const field *f = &d.fields[k];
        const int unit = f->kind == OF_Q ? find_unit(OF_Q, f->unit, (int)strlen(f->unit)) : -1;
        if (unit >= 0 && strcmp(known_units[unit].si, "rad") == 0) hinges |= 1u << f->index;
        unknown &= f->kind != OF_Q || unit < 0;
    }
    if (hinges == (unsigned)M(angles)) {
        if (!hinges && unknown)
            say("hint: if q are hinges in rad, #define ROLN_ANGLES gives the networks their cosines and sines\n");
        return;
    }
    say("hint: these hinges are numbers to the networks; for their cosines and sines: #define ROLN_ANGLES");
    for (k = 0; k < (int)M(N); k++)
        say("%s %u", k ? "," : "", hinges >> k & 1);
    say("\n");
}

/* The inputs of driven joints become their accelerations: the mean one up to the next sample, and that of the sample. Without
   torque=1 no force acts on the other joints. */
static void drive(motion *m)
{
    enum { N = M(N), F = M(force_size), FREE = N - (int)M(driven) };
    int k, i, j;
    for (k = 0; k < m->trajectories; k++)
        for (i = m->first[k]; i < m->first[k + 1]; i++)
            for (j = 0; j < F && (int)M(driven) > 0; j++) {
                const int at = i * N + j, end = i + 1 == m->first[k + 1];
                if (j >= FREE) m->tau_mid[at] = m->qdd[at];
                if (j >= FREE) m->tau[at] = end ? m->qdd[at] : (m->qd[at + N] - m->qd[at]) / (roln_real)m->dt;
                else if (!(set("torque") > 0)) m->tau[at] = m->tau_mid[at] = 0;
            }
}

/* Treats a file of spread= like the other recordings: unit of torques, smoothing, delay, driven joints. */
static void prepare_spread(motion *m)
{
    to_unit_of_tau(m, unit_of_tau(m) / torque_scale);
    if (set("smooth") > 0) smooth_positions(m);
    if (delay_found != 0) shift_torques(m, delay_found);
    drive(m);
}

/* Reads spread= with the columns and the filter of w, at the rate of the other recordings. */
static void read_more(wanted w)
{
    if (set("noise") > 0 || words[SMOOTHER].value)
        fail("spread= and %s=: not together\nhint: name all recordings without spread=", set("noise") > 0 ? "noise" : "smoother");
    w.tell = 0, w.dt = d.dt, w.like = &d;
    read_spread(words[SPREAD].value, &w, prepare_spread);
}

/* Reads test= with the columns of w, which must be those of the other recordings. */
static motion read_test(wanted w)
{
    file_list tests = {NULL, 0};
    w.qd_unused = w.tell = 0, w.like = &d;
    add_files(&tests, words[TEST].value);
    return read_recordings(tests.count, tests.path, &w);
}

/* Reads motion.csv, and a second file if there is one. */
static void read_all(void)
{
    wanted w = {.model = STRING(MODEL), .N = M(N), .inputs = M(inputs), .angles = M(angles), .each = M(own)};
    int k;
    for (k = T_COLUMN; k <= FILTER; k++)
        if (words[k].value) read_key(&w, words[k].key, words[k].value);
    w.torque = set("torque") > 0, w.half = (int)set("smooth"), w.dt = set("dt");
    w.driven = (int)M(driven) > 0;
    w.own_unit = w.torque && (int)M(inputs) == 0 && (int)M(actuator) == 0 && (int)M(driven) == 0 &&
                 !(set("inertia") > 0); /* inertia= is in the unit of the recordings */
    if (words[SMOOTHER].value) read_smoother(words[SMOOTHER].value), w.filter = -1;
    w.qd_unused = set("noise") > 0 || set("smooth") > 0 || words[SMOOTHER].value, w.tell = 1;
    d = read_recordings(inputs.count, inputs.path, &w);
    if (words[TEST].value) unseen = read_test(w);
    k = d.trajectories, torque_scale = unit_of_tau(&d);
    if (!(w.filter > 0)) w.filter = d.reach > 0 ? KERNEL_BAND / d.reach : -1;
    to_unit_of_tau(&unseen, unit_of_tau(&unseen) / torque_scale);
    if (set("noise") > 0) {
        double sd[M(N)];
        add_noise(&d, set("noise"), M(own), (uint64_t)set("seed") + 5000, sd);
        say("noise of standard deviation %.3g added to q%s\n", sd[0], M(own) ? "1, and to each joint in its measure" : "");
    }
    if (set("smooth") > 0) smooth_positions(&d);
    if (words[TEST].value && !unseen.has_qd) smooth_positions(&unseen);
    settle_delay(words[DELAY].value, words[TEST].value ? &unseen : NULL);
    drive(&d);
    if (words[TEST].value) drive(&unseen);
    if (words[SMOOTHER].value) {
        smoother.p.scale.m /= (roln_real)torque_scale;
        smooth_motion(&d, words[SMOOTHER].value);
        if (unseen.qd_derived) smooth_motion(&unseen, words[SMOOTHER].value);
        drive(&d);
        if (words[TEST].value) drive(&unseen);
    }
    if (words[SPREAD].value) read_more(w);
    remember_starts();
    train = hold_out(&d, words[HELD].value, set("look"));
    if (train < 1 || train >= d.trajectories)
        fail("%d recordings of %s, %d samples, and held=%s: at least 1 to train with and 1 held out are needed\nhint: held=0.1 "
             "holds out one in ten, and one at least; held=none holds out nothing; or longer recordings",
             k, d.path, d.samples, words[HELD].value);
    say("%d recordings (%d held out), %d samples of %g s, N = %d, n = %d, %d parameters\n", d.trajectories,
        d.trajectories - train, d.samples, d.dt, (int)M(N), (int)M(n), (int)M(theta_size));
    check_false_alarms();
    if (strcmp(words[HELD].value, "none") == 0) say("held=none: errors below are of recordings that are trained with\n");
    tell_hinges();
    if (d.has_tau && !(set("torque") > 0)) say("columns tau count for nothing without torque=1\n");
}

static void halt(int sig)
{
    halted = sig;
    signal(sig, SIG_DFL); /* the second one ends the program at once */
}

/* Signals that ask for an end: the training ends, and keeps what it has. Signals of a pipe that is closed or a file that is too
   large: writing fails, and training goes on. */
static void catch_signals(void)
{
    signal(SIGINT, halt), signal(SIGTERM, halt);
#ifdef SIGHUP
    signal(SIGHUP, halt);
#endif
#ifdef ROLN_MPI
    signal(SIGUSR1, halt); /* mpirun passes it on to all processes, and does not end */
#endif
#ifdef SIGPIPE
    signal(SIGPIPE, SIG_IGN);
#endif
#ifdef SIGXFSZ
    signal(SIGXFSZ, SIG_IGN);
#endif
}

int main(int argc, char **argv)
{
    int i;
    begin_processes();
    for (i = 1; i < argc; i++)
        if (strcmp(argv[i], "--help") == 0 || strcmp(argv[i], "-h") == 0) return help(), end_processes(DONE);
    launched = began = now();
    read_settings(argc, argv);
    check_start();
    tell_unused();
    catch_signals();
    if (process == 0) claim_place(), check_place();
    read_all();
    atexit(rescue);
    check_alike_everywhere();
    fit_baseline();
    if (!resume()) start(), hand_out(0, &s, sizeof s), s.best = s.p;
    for (; s.stage < STAGES; s.stage++)
        if (updates_of(s.stage) > 0 && !halting()) run();
    if (find_spread_range()) object("the range of z overflows in spread=");
    if (process > 0) return end_processes(DONE);
    leave_processes();
    i = report();
    return end_processes(i);
}
