/* train.c - train a model on recorded motion.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. -Iexamples -DMODEL=pend16 examples/train.c -o train -lpthread -lm
   ./train motion.csv [test=FILE] [out=PREFIX] [from=FILE] [method=adam] [key=value ...]

   MODEL is the ROLN_NAME of a config header, which is named after it (pend16.h: the sizes, see roln.h). motion.csv has a
   header line, the columns t, q.., qd.., tau.. and a blank line between trajectories; tau is held from each sample to the
   next, and its columns may be left out unless torque=1. Stages, each of which ends with the weights that predicted held-out
   trajectories best:

     chart     with ROLN_CHART: the encoder that a polynomial decoder undoes best, then the decoder in closed form
     layers    of an autoencoder without chart: Riemannian Adam on their reconstruction
     networks  recursive Gauss-Newton on accelerations, then also on windows of half a second, until held-out trajectories are
               predicted no better; or, method=adam, Riemannian Adam on accelerations, of all parameters together

   Written at every look at the held-out trajectories: OUT.svg, the learning curve, and OUT.check, from which resume=1 goes on, with
   the same bits as if nothing had happened. In the end: OUT_weights.h (C definition for flash), OUT.roln (packed bytes), a table of
   errors, each with its standard error over trajectories. Keys and defaults: `settings`.

   1 settings     2 recorded motion     3 noise     4 threads     5 state     6 errors     7 chart     8 Gauss-Newton     9 Adam
   10 curve, checkpoint     11 stages     12 main */

#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <pthread.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) STRING(m.h)
#define HEADER(m) HEADER_(m)
#define ROLN_ROWS 2000 /* samples of a step of Gauss-Newton */
#include HEADER(MODEL)

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name) /* M(params) is pend16_params */

/* ---- 1 settings ---- */

static struct {
    const char *key;
    double value;
} settings[] = {
    {"seed", 1},       /* of weights, samples and noise: trainings of one config end at different errors */
    {"seconds", 0},    /* end after so many at the latest; 0: no limit, and the same bits in every run */
    {"steps", 0},      /* end after so many steps of Gauss-Newton; 0: when held-out trajectories are predicted no better */
    {"held", 0.1},     /* part of the trajectories that is held out */
    {"look", 1},       /* s that these are predicted ahead, to see which weights are best; at most half of the shortest one */
    {"window", 0.5},   /* s, length of a window, at most ROLN_HORIZON steps of 20 ms or of a sample; 0: no windows */
    {"torque", 0},     /* 1: use the tau columns, 0: no force does work */
    {"force", 0},      /* weight of the inverse dynamics beside accelerations: where torques work it fixes M and g themselves */
    {"noise", 0},      /* Gaussian noise added to q of motion.csv, over rms(q - mean); qd, qdd then from differences of q */
    {"smooth", 0},     /* q, qd, qdd of motion.csv from a parabola through this many samples of q on each side; 0: none */
    {"ae", 20000},     /* layers: updates of Adam on their reconstruction */
    {"acc", 100000},   /* method=adam: updates on accelerations */
    {"lr_ae", 0.1},    /* Adam: learning rate of the layers (Frobenius length of a step); less in wide ones */
    {"lr_net", 3e-3},  /* Adam: learning rate of the networks */
    {"threads", 2},    /* at most 16; changes no bit */
    {"resume", 0},     /* 1: go on from OUT.check, if it is there */
};
enum { SETTINGS = sizeof settings / sizeof *settings };
static struct {
    const char *key, *value;
} words[] = {{"out", STRING(MODEL)}, {"test", NULL}, {"from", NULL}, {"method", "newton"}};
enum { OUT, TEST, FROM, METHOD, WORDS };

/* Message and exit. */
static void fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    vfprintf(stderr, format, list);
    va_end(list);
    fputc('\n', stderr);
    exit(1);
}

static double set(const char *key)
{
    size_t i;
    for (i = 0; i < SETTINGS; i++)
        if (strcmp(settings[i].key, key) == 0) return settings[i].value;
    fail("no setting %s", key);
    return 0;
}

/* The arguments key=value, from the third on. */
static void read_settings(int argc, char **argv)
{
    int i;
    for (i = 2; i < argc; i++) {
        char *eq = strchr(argv[i], '=');
        size_t k, known = 0;
        if (!eq) fail("%s: not key=value", argv[i]);
        *eq = 0;
        for (k = 0; k < WORDS; k++)
            if (strcmp(words[k].key, argv[i]) == 0) words[k].value = eq + 1, known = 1;
        for (k = 0; k < SETTINGS; k++)
            if (strcmp(settings[k].key, argv[i]) == 0) {
                char *end;
                settings[k].value = strtod(eq + 1, &end), known = 1;
                if (end == eq + 1 || *end || !isfinite(settings[k].value)) fail("%s=%s: not a number", argv[i], eq + 1);
                if (settings[k].value < 0) fail("%s=%s: at least 0", argv[i], eq + 1);
            }
        if (!known) fail("unknown setting %s", argv[i]);
    }
    if (strcmp(words[METHOD].value, "newton") != 0 && strcmp(words[METHOD].value, "adam") != 0)
        fail("method=%s: newton or adam", words[METHOD].value);
    if (!(set("threads") >= 1 && set("threads") <= 16)) fail("threads=%g: 1 .. 16", set("threads"));
}

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static void *room(size_t bytes)
{
    void *p = calloc(1, bytes ? bytes : 1);
    if (!p) fail("out of memory");
    return p;
}

/* ---- 2 recorded motion ---- */

typedef struct {
    int trajectories, samples, *first; /* first [trajectories + 1] */
    double dt;
    roln_real *q, *qd, *qdd, *tau; /* [samples][N] */
    roln_real *tau_mid;            /* mean of the torques held before and after a sample: that of a central difference */
} motion;

/* dx = dx/dt by central differences inside each trajectory, one-sided at its ends. */
static void differences(const motion *d, const roln_real *x, roln_real *dx)
{
    enum { N = M(N) };
    int k, i, j;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k]; i < d->first[k + 1]; i++) {
            const int lo = i > d->first[k] ? i - 1 : i, hi = i + 1 < d->first[k + 1] ? i + 1 : i;
            for (j = 0; j < N && lo < hi; j++)
                dx[i * N + j] = (x[hi * N + j] - x[lo * N + j]) / (roln_real)((hi - lo) * d->dt);
        }
}

/* Numbers of one line, the first `most` of them into v. Returns how many there are; what is none ends the program. */
static int read_line(const char *path, int row, const char *line, int most, double *v)
{
    const char *p = line;
    char *end;
    int n = 0;
    for (;;) {
        const double x = strtod(p, &end);
        if (end == p || !isfinite(x)) fail("%s, line %d: column %d is not a finite number", path, row, n + 1);
        if (n < most) v[n] = x;
        n++;
        p = end + strspn(end, " \t\r\n");
        if (*p == 0) return n;
        if (*p == ',') p++;
    }
}

static motion read_csv(const char *path)
{
    enum { N = M(N), FREE = 1 + 2 * N, ALL = 1 + 3 * N }; /* columns without and with tau */
    static char line[64 * ALL + 64];
    motion d = {0};
    double v[ALL], t0 = 0, t1 = 0;
    size_t lines = 0, size;
    int blank = 1, columns = 0, row = 1, i, k;
    FILE *f = fopen(path, "r");
    if (!f) fail("cannot read %s", path);
    while (fgets(line, sizeof line, f)) lines++;
    rewind(f);
    size = lines * N * sizeof(roln_real);
    d.q = room(size), d.qd = room(size), d.qdd = room(size), d.tau = room(size), d.tau_mid = room(size);
    d.first = room((lines + 2) * sizeof *d.first);
    if (!fgets(line, sizeof line, f)) fail("%s is empty", path);
    while (fgets(line, sizeof line, f)) {
        int n;
        row++;
        if (!strchr(line, '\n') && !feof(f)) fail("%s, line %d is too long for 1 + 3 * %d columns", path, row, (int)N);
        if (line[strspn(line, " \t\r\n")] == 0) {
            blank = 1;
            continue;
        }
        n = read_line(path, row, line, ALL, v);
        if (columns == 0) columns = n;
        if (n != columns) fail("%s, line %d has %d columns, the lines before it %d", path, row, n, columns);
        if (n == FREE && set("torque") > 0) fail("%s has no tau columns, which torque=1 needs", path);
        if (n != FREE && n != ALL)
            fail("%s has %d columns, but " STRING(MODEL) " needs %d (t, %d q, %d qd) or %d (and %d tau)", path, n, (int)FREE,
                 (int)N, (int)N, (int)ALL, (int)N);
        if (blank) d.first[d.trajectories++] = d.samples;
        if (d.samples == 0) t0 = t1 = v[0];
        if (d.samples == 1 && d.trajectories == 1) t1 = v[0];
        blank = 0;
        for (i = 0; i < N; i++) {
            d.q[d.samples * N + i] = (roln_real)v[1 + i];
            d.qd[d.samples * N + i] = (roln_real)v[1 + N + i];
            if (n == ALL) d.tau[d.samples * N + i] = (roln_real)v[1 + 2 * N + i];
        }
        d.samples++;
    }
    fclose(f);
    d.first[d.trajectories] = d.samples;
    d.dt = t1 - t0;
    if (d.samples == 0) fail("%s has no samples", path);
    if (!(d.dt > 0)) fail("%s: t must grow; its first two samples are %g s apart", path, d.dt);
    differences(&d, d.qd, d.qdd);
    for (k = 0; k < d.trajectories; k++)
        for (i = d.first[k] * N; i < d.first[k + 1] * N; i++)
            d.tau_mid[i] = i < (d.first[k] + 1) * N ? d.tau[i] : (d.tau[i - N] + d.tau[i]) / 2;
    return d;
}

/* ---- 3 noise ---- */

/* q += level rms(q - mean) normal, mean over the samples of each joint, rms over all samples and joints; then qd, qdd as an
   encoder without tachometer would give them. Returns the standard deviation of the noise. */
static double add_noise(motion *d, double level, uint64_t seed)
{
    enum { N = M(N) };
    double square = 0, sd;
    int i, j;
    for (j = 0; j < N; j++) {
        double mean = 0;
        for (i = 0; i < d->samples; i++)
            mean += (double)d->q[i * N + j] / d->samples;
        for (i = 0; i < d->samples; i++)
            square += ((double)d->q[i * N + j] - mean) * ((double)d->q[i * N + j] - mean);
    }
    sd = level * sqrt(square / d->samples / N);
    for (i = 0; i < d->samples * N; i++)
        d->q[i] += (roln_real)sd * roln_normal(&seed);
    differences(d, d->q, d->qd);
    differences(d, d->qd, d->qdd);
    return sd;
}

/* Savitzky-Golay: q, qd, qdd of each sample from the least-squares parabola c0 + c1 x + c2 x^2 through q of the samples at
   x = -half .. half about it; at the ends of a trajectory from its first or last 2 half + 1 samples. */
static void smooth(motion *d, int half)
{
    enum { N = M(N) };
    const double dt = d->dt;
    double s0 = 2 * half + 1, s2 = 0, s4 = 0, det, *y = room((size_t)d->samples * sizeof *y);
    int k, i, j, x;
    for (x = -half; x <= half; x++)
        s2 += (double)x * x, s4 += (double)x * x * x * x;
    det = s0 * s4 - s2 * s2;
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], b = d->first[k + 1];
        if (b - a <= 2 * half) fail("smooth=%d needs %d samples, trajectory %d has %d", half, 2 * half + 1, k + 1, b - a);
        for (j = 0; j < N; j++) {
            for (i = a; i < b; i++)
                y[i] = (double)d->q[i * N + j];
            for (i = a; i < b; i++) {
                const int mid = i < a + half ? a + half : i > b - 1 - half ? b - 1 - half : i;
                const double u = i - mid;
                double y0 = 0, y1 = 0, y2 = 0, c0, c1, c2;
                for (x = -half; x <= half; x++)
                    y0 += y[mid + x], y1 += x * y[mid + x], y2 += (double)x * x * y[mid + x];
                c0 = (s4 * y0 - s2 * y2) / det, c1 = y1 / s2, c2 = (s0 * y2 - s2 * y0) / det;
                d->q[i * N + j] = (roln_real)(c0 + u * (c1 + u * c2));
                d->qd[i * N + j] = (roln_real)((c1 + 2 * u * c2) / dt);
                d->qdd[i * N + j] = (roln_real)(2 * c2 / (dt * dt));
            }
        }
    }
    free(y);
}

/* ---- 4 threads ---- */

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
    pthread_t id[THREADS];
    const int threads = (int)set("threads");
    int t;
    for (t = 0; t < threads; t++) {
        const hand own = {job, ctx, parts, t, threads};
        h[t] = own;
        if (t > 0 && pthread_create(&id[t], NULL, work_off, &h[t]) != 0) fail("no thread");
    }
    work_off(&h[0]);
    for (t = 1; t < threads; t++)
        pthread_join(id[t], NULL);
}

/* ---- 5 state ---- */

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
    p.start = room((size_t)d.samples * sizeof *p.start);
    do
        p.count = windows(&d, 0, train, steps > 0 ? p.steps * stride : 1, 1, 1, p.start);
    while (p.count == 0 && p.steps-- > 1);
    return p;
}

/* ---- 6 errors ---- */

/* E_q, E_qd, their standard errors; geometric mean of E_q over the trajectories, in which a wild one counts no more than others. */
typedef struct { double q, qd, q_off, qd_off, typical; } error;

typedef struct {
    const motion *m;
    const M(params) *p;
    int from, samples, stride, every, *start;
    double (*sums)[4];
} rollout;

/* Windows of one trajectory: sums of |q_pred - q|^2, |q - qbar|^2, |qd_pred - qd|^2, |qd|^2. */
static void roll(void *ctx, int k, int thread)
{
    const rollout *r = ctx;
    const int at = r->from + k, steps = r->samples / r->stride;
    int *start = r->start + r->m->first[at];
    roln_error e[2] = {{0}}, *last = steps > 0 ? e + 1 : e;
    roln_batch b = {.steps = steps, .stride = r->stride, .start = start, .q = r->m->q, .qd = r->m->qd};
    b.tau = set("torque") > 0 ? r->m->tau : NULL;
    b.count = windows(r->m, at, at + 1, r->samples, r->every, 0, start);
    if (b.count > 0 && M(errors)(r->p, &b, (roln_real)(r->m->dt * r->stride), steps > 0 ? steps : 1, s.qbar, e, &work[thread]))
        last->q = last->qd = (roln_real)1e18; /* it ran away */
    r->sums[k][0] = (double)last->q, r->sums[k][1] = (double)last->q_var;
    r->sums[k][2] = (double)last->qd, r->sums[k][3] = (double)last->qd_var;
}

/* sqrt(sum a / sum b), and its standard error: each trajectory left out in turn (jackknife). */
static double ratio(int count, double (*sums)[4], int which, double *off)
{
    double a = 0, b = 0, mean = 0, square = 0;
    int k;
    for (k = 0; k < count; k++)
        a += sums[k][which], b += sums[k][which + 1];
    for (k = 0; k < count; k++) {
        const double e = sqrt(fabs(a - sums[k][which]) / fmax(b - sums[k][which + 1], 1e-30));
        mean += e / count, square += e * e / count;
    }
    *off = count > 1 ? sqrt(fmax(0, square - mean * mean) * (count - 1)) : 1e6; /* of one nobody knows */
    return b > 0 ? fmin(sqrt(a / b), 1e6) : 1e6;
}

/* Errors after `samples` samples in steps of `stride`, of windows every `every` samples of trajectories from .. to-1. */
static error errors(const motion *m, const M(params) *p, int from, int to, int samples, int stride, int every)
{
    rollout r = {m, p, from, samples, stride, every, NULL, NULL};
    error e = {0};
    int k;
    r.start = room((size_t)m->samples * sizeof *r.start), r.sums = room((size_t)(to - from) * sizeof *r.sums);
    share(to - from, roll, &r);
    e.q = ratio(to - from, r.sums, 0, &e.q_off), e.qd = ratio(to - from, r.sums, 2, &e.qd_off);
    for (k = 0; k < to - from; k++)
        e.typical += log(fmin(sqrt(fmax(r.sums[k][0], 1e-30) / fmax(r.sums[k][1], 1e-30)), 1e6)) / (to - from);
    e.typical = exp(e.typical);
    free(r.start), free(r.sums);
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

static void table(const char *name, const motion *m, int from, int to)
{
    static const double ms[] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2995};
    const int every = stride_of(m, 0.025), stride = stride_of(m, 0.005);
    int last = -1;
    size_t i;
    printf("%s\n   ms    E_q %%      +-   E_qd %%      +-\n", name);
    for (i = 0; i < sizeof ms / sizeof *ms; i++) {
        const int samples = (int)(ms[i] * 1e-3 / m->dt + 0.5);
        error e;
        if (samples == last || samples >= m->first[from + 1] - m->first[from]) continue;
        last = samples;
        e = errors(m, &s.p, from, to, samples, samples % stride ? 1 : stride, every);
        printf("%5.4g %8s %7s %8s %7s\n", 1e3 * samples * m->dt, in_percent(e.q).text, in_percent(e.q_off).text,
               in_percent(e.qd).text, in_percent(e.qd_off).text);
    }
}

/* ---- 7 chart ---- */

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
        st = M(chart_turn)(&s.p, &b, &turn, &residual);
        steps += st == ROLN_OK;
    }
    if (st != ROLN_OK && st != ROLN_E_NO_CONVERGENCE) fail("chart: status %d", (int)st);
    st = M(chart_add)(&s.p, count, d.q, &sums, &scratch);
    if (st == ROLN_OK) st = M(chart_solve)(&s.p, &sums, ROLN_CHART_RIDGE, &residual, &scratch);
    if (st != ROLN_OK) fail("chart: status %d; a lower degree?", (int)st);
    printf("chart: the decoder leaves %.3g %% of q, after %d steps of the encoder, %.0f s\n", 100 * (double)residual, steps,
           seconds());
#endif
}

/* ---- 8 Gauss-Newton ---- */

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
        if (tries == 100) fail("the model can not be evaluated on the data any more: status %d", (int)st);
    st = M(newton_rows)(&s.p, &opt, PARTS * PART, &residuals, &s.newton);
    if (st != ROLN_OK) fail("rows: status %d", (int)st);
    share((int)set("threads"), sum, &opt);
    f->p = &s.newton.next, f->again = 1;
    for (tries = 0; tries < TRIES; tries++) {
        st = M(newton_step)(&s.p, &opt, PARTS * PART, &residuals, &s.newton);
        if (st != ROLN_OK) fail("step: status %d", (int)st);
        share(JUDGES, fill, f);
        if (M(newton_judge)(&s.p, PARTS * PART, JUDGES * PART, &residuals, &s.newton)) break;
    }
    if (tries == TRIES) roln_newton_over(damping, &s.newton.state);
    for (k = 0; k < M(newton_size); k++)
        s.mean[k] += (s.p.theta[M(newton_from) + k] - s.mean[k]) / (roln_real)(s.step < 8 ? s.step + 1 : 8);
}

/* ---- 9 Adam ---- */

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

/* ---- 10 curve, checkpoint ---- */

static FILE *file(const char *suffix, const char *mode)
{
    char path[512];
    FILE *f;
    snprintf(path, sizeof path, "%s%s", words[OUT].value, suffix);
    f = fopen(path, mode);
    if (!f && *mode != 'r') fail("cannot write %s", path);
    return f;
}

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

/* What a checkpoint belongs to. */
typedef struct {
    uint64_t config, data, from; /* checksums */
    size_t size;
    int samples, trajectories;
    char method[8];
    double value[SETTINGS];
} origin;

static uint64_t checksum_of(const roln_real *x)
{
    return roln_fnv(d.samples * M(N) * (int)sizeof *x, (const unsigned char *)x, ROLN_FNV);
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
    M(pack)(&none, bytes);
    if (data == 0) data = checksum_of(d.q) ^ 3 * checksum_of(d.qd) ^ 5 * checksum_of(d.tau);
    o.config = roln_fnv((int)sizeof bytes, bytes, ROLN_FNV), o.data = data;
    o.from = roln_fnv((int)strlen(from), (const unsigned char *)from, ROLN_FNV);
    o.size = sizeof s, o.samples = d.samples, o.trajectories = d.trajectories;
    snprintf(o.method, sizeof o.method, "%s", words[METHOD].value);
    for (i = 0; i < SETTINGS; i++)
        o.value[i] = strstr(may_change, settings[i].key) ? 0 : settings[i].value;
    return o;
}

/* OUT.check: whenever the power fails, either the old one is there or the new one. */
static void checkpoint(void)
{
    const origin o = origin_of();
    char part[512], path[512];
    FILE *f = file(".part", "wb");
    s.seconds = seconds(), began = now();
    snprintf(part, sizeof part, "%s.part", words[OUT].value);
    snprintf(path, sizeof path, "%s.check", words[OUT].value);
    if (fwrite(&o, sizeof o, 1, f) != 1 || fwrite(&s, sizeof s, 1, f) != 1 || fclose(f) != 0 || rename(part, path) != 0)
        fail("cannot write %s", path);
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

/* ---- 11 stages ---- */

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
    memset(s.newton.rest, 0, sizeof s.newton.rest);
    printf("back to step %d, with a memory of %g steps\n", s.best_step, (double)s.memory);
    s.since = s.step;
}

/* How the weights, averaged where that makes sense, predict held-out trajectories 25 ms and `look` seconds ahead; of layers alone,
   how they reconstruct them. Keeps the best. */
static void look(void)
{
    const int stride = stride_of(&d, 0.005);
    int shortest = d.samples, k, far, near;
    M(params) p = s.p;
    error e[2];
    for (k = train; k < d.trajectories; k++)
        if (d.first[k + 1] - d.first[k] < shortest) shortest = d.first[k + 1] - d.first[k];
    far = s.stage == LAYERS ? 0 : (int)fmax(1, fmin(set("look"), shortest / 2 * d.dt) / d.dt / stride + 0.5) * stride;
    near = (int)fmin(stride_of(&d, 0.025) / stride * stride, far);
    if (s.stage == NEWTON && FLAT && s.step > 0) memcpy(p.theta + M(newton_from), s.mean, sizeof s.mean);
    e[0] = errors(&d, &p, train, d.trajectories, near, stride, stride_of(&d, 0.1));
    e[1] = errors(&d, &p, train, d.trajectories, far, stride, stride_of(&d, 0.1));
    s.ahead = far * d.dt;
    if (s.step == 0 || e[1].typical < s.best_error) s.best_error = e[1].typical, s.best = p, s.best_step = s.since = s.step;
    printf("%7d  E_q(%.3g ms) %7s %%  E_q(%.3g s) %7s +- %s %%, typical %s %%", s.step, 1e3 * near * d.dt, in_percent(e[0].q).text,
           far * d.dt, in_percent(e[1].q).text, in_percent(e[1].q_off).text, in_percent(e[1].typical).text);
    if (s.stage == NEWTON)
        printf("  residual %.2e  damping %.0e", sqrt((double)s.newton.state.loss / ROWS), (double)s.newton.state.lambda);
    printf("  %.0f s\n", seconds());
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
    const int adam = strcmp(words[METHOD].value, "adam") == 0, layers = M(ae_layers) > 0 && M(degree) == 0;
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
    pool samples = pool_of(0, 1), longer = pool_of(most < M(horizon) ? most : M(horizon), stride);
    if (longer.steps == 0) longer.count = 0;
    f.samples = a.samples = &samples, f.windows = &longer;
    if (samples.count < 1) fail("trajectories of at least 3 samples are needed");
    if (s.next == 0) s.newton.state = fresh, s.memory = 8, printf("%s\n", stage_names[s.stage]);
    while (s.next == 0 || !done(updates)) {
        if (s.step == s.next) {
            s.next += s.stage == NEWTON ? 4 + s.next / 8 : updates / 20 + 1;
            look();
            checkpoint();
        }
        if (s.stage == NEWTON) newton_step(&f);
        else adam_step(&a, updates);
        s.step++;
    }
    look();
    s.p = s.best, s.step = s.next = 0;
    free(samples.start), free(longer.start);
}

/* ---- 12 main ---- */

/* The POD, then the chart; or the packed weights that the user names. */
static void start(void)
{
    static M(start) scratch;
    static unsigned char bytes[M(packed_size)];
    s.seed = (uint64_t)set("seed");
    if (M(init_pod)(&s.p, d.first[train], d.q, d.qd, s.qbar, &s.seed, &scratch) != ROLN_OK)
        fail("no start from this data: it does not move, or its numbers are too large");
    if (words[FROM].value) {
        FILE *f = fopen(words[FROM].value, "rb");
        if (!f || M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &s.p) != ROLN_OK)
            fail("cannot start from %s", words[FROM].value);
        fclose(f);
    } else {
        fit_chart();
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
    if (M(fit_range)(&s.p, d.first[train], d.q, d.qd, &scratch) != ROLN_OK) fail("no range");
    M(pack)(&s.p, bytes);
    f = file(".roln", "wb");
    if (fwrite(bytes, 1, sizeof bytes, f) != sizeof bytes || fclose(f) != 0) fail("cannot write %s.roln", words[OUT].value);
    f = file("_weights.h", "w");
    if (M(write)(&s.p, put_file, f) != ROLN_OK || ferror(f) || fclose(f) != 0) fail("cannot write %s_weights.h", words[OUT].value);
    printf("wrote %s.roln and %s_weights.h after %.0f s\n", words[OUT].value, words[OUT].value, seconds());
    printf("held-out trajectories are predicted with a typical E_q of %.3f %% after %.3g s\n", 100 * s.best_error, s.ahead);
}

int main(int argc, char **argv)
{
    motion unseen = {0};
    if (argc < 2) fail("usage: train motion.csv [test=FILE] [out=PREFIX] [from=FILE] [method=adam] [key=value ...]");
    began = now();
    read_settings(argc, argv);
    d = read_csv(argv[1]);
    if (words[TEST].value) unseen = read_csv(words[TEST].value);
    train = d.trajectories - (int)ceil(d.trajectories * set("held"));
    if (train < 1 || train >= d.trajectories)
        fail("%d trajectories and held=%g: at least 1 to train with and 1 held out are needed", d.trajectories, set("held"));
    printf("%d trajectories (%d held out), %d samples of %g s, N = %d, n = %d, %d parameters\n", d.trajectories,
           d.trajectories - train, d.samples, d.dt, (int)M(N), (int)M(n), (int)M(theta_size));
    if (set("noise") > 0) /* after `unseen` was read, which stays as it is */
        printf("noise of standard deviation %.3g added to q\n", add_noise(&d, set("noise"), (uint64_t)set("seed") + 5000));
    if (set("smooth") >= 1) {
        printf("q, qd, qdd smoothed over %d samples\n", 2 * (int)set("smooth") + 1);
        smooth(&d, (int)set("smooth"));
    }
    fclose(file(".roln", "ab")); /* now rather than after the training */
    if (!resume()) start();
    for (; s.stage < STAGES; s.stage++)
        if (updates_of(s.stage) > 0) run();
    save();
    table(set("noise") > 0 || set("smooth") >= 1 ? "held-out trajectories, altered as above" : "held-out trajectories", &d, train,
          d.trajectories);
    if (words[TEST].value) table(words[TEST].value, &unseen, 0, unseen.trajectories);
    return 0;
}
