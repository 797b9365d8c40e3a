/* train.c - train a model on recorded motion.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. -Iexamples -DMODEL=pend16 examples/train.c -o train -lpthread -lm
   ./train motion.csv [key=value ...]

   MODEL is the ROLN_NAME of a config header, which is named after it (pend16.h: the sizes, see roln.h). motion.csv has a
   header line, the columns t, q.., qd.., tau.. and a blank line between trajectories; tau is held from each sample to the
   next, and its columns may be left out unless torque=1. Training starts at the POD and has three stages, each with a falling
   learning rate: the autoencoder alone, the acceleration loss, the ODE loss over windows of several steps (with positions=1 the
   variational loss, which needs no velocities). Each ends with the weights that predicted held-out trajectories best. They are
   written as OUT_weights.h (C definition for flash) and OUT.roln (packed bytes). Keys and defaults: `settings`. */

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
#include HEADER(MODEL)

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name) /* M(params) is pend16_params */

enum { SLICES = 4 }; /* parts of a batch, one thread each; their gradients are added in order, whatever the machine */

static struct {
    const char *key;
    double value;
} settings[] = {
    {"seed", 1},        /* of weights, shuffling and noise */
    {"ae", 20000},      /* updates of the autoencoder alone, on its reconstruction */
    {"acc", 100000},    /* updates with the acceleration loss */
    {"ode", 10000},     /* updates with the ODE loss */
    {"ae_batch", 128},  /* samples per update of the autoencoder alone */
    {"batch", 64},      /* windows per update */
    {"steps", 8},       /* steps per window, at most ROLN_HORIZON */
    {"stride", 5},      /* samples per step */
    {"lr_ae", 0.1},     /* learning rate of the autoencoder alone (Frobenius length of a step) */
    {"lr_joint", 0.1},  /* ... in the two later stages; 0: frozen, sequential training */
    {"bias", 1},        /* learning rate of the autoencoder's biases over that of its matrices; less in wide layers */
    {"lr_net", 3e-3},   /* learning rate of the networks in these */
    {"fall", 1e-3},     /* last learning rate over first, in each stage */
    {"ode_lr", 0.3},    /* learning rates of the ODE stage over those of the acceleration stage */
    {"decay", 0},       /* weight decay */
    {"clip", 10},       /* bound of the gradient norm */
    {"w_q", 2},         /* weight of the reconstruction of q */
    {"w_acc", 0.1},     /* weight of the accelerations in the acceleration loss */
    {"w_force", 0},     /* weight of the inverse dynamics in the acceleration loss, for data with torques */
    {"w_pos", 0},       /* weight of the predicted positions (z and q) in the ODE loss */
    {"positions", 0},   /* 1: the ODE stage sees positions only (variational loss) */
    {"scaled", 0},      /* 1: each loss term over the variance of its data */
    {"torque", 0},      /* 1: use the tau columns, 0: no force does work */
    {"held", 0.1},      /* part of the trajectories held out for validation */
    {"look", 0.1},      /* validation roll-out, s */
    {"from", 0},        /* 1: start from OUT.roln */
    {"noise", 0},       /* Gaussian noise added to q of motion.csv, over rms(q - mean); qd, qdd then from differences of q */
    {"smooth", 0},      /* q, qd, qdd of motion.csv from a parabola through this many samples of q on each side; 0: none */
};

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
    for (i = 0; i < sizeof settings / sizeof *settings; i++)
        if (strcmp(settings[i].key, key) == 0) return settings[i].value;
    fail("no setting %s", key);
    return 0;
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

/* ---- motion ---- */

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

/* ---- noise and smoothing ---- */

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

/* ---- windows ---- */

/* First samples of all windows of trajectories a .. b-1 that reach `reach` samples on; every `every` samples, from `skip`. */
static int windows(const motion *d, int a, int b, int reach, int every, int skip, int *start)
{
    int count = 0, k, i;
    for (k = a; k < b; k++)
        for (i = d->first[k] + skip; i + reach < d->first[k + 1]; i += every)
            start[count++] = i;
    return count;
}

/* ---- training ---- */

static M(params) params, best;
static M(optimiser) optimiser;
static M(gradient) slice_gradient[SLICES];
static M(train) slice_work[SLICES];
static M(start) start_work;
static roln_real qbar[M(N)];

typedef struct {
    int acc;
    double dt;
    roln_loss weights;
    roln_batch batch;
    M(gradient) *gradient;
    M(train) *work;
    roln_status status;
} slice;

static void *run_slice(void *arg)
{
    slice *s = arg;
    memset(s->gradient, 0, sizeof *s->gradient);
    s->status = s->acc ? M(grad_acc)(&params, &s->weights, &s->batch, s->gradient, s->work)
                       : M(grad)(&params, &s->weights, &s->batch, (roln_real)s->dt, s->gradient, s->work);
    return NULL;
}

/* a += b, term by term. */
static void add(roln_loss *a, const roln_loss *b)
{
    a->q += b->q, a->qd += b->qd, a->qdd += b->qdd;
    a->z += b->z, a->zd += b->zd, a->zdd += b->zdd;
    a->q_pred += b->q_pred, a->qd_pred += b->qd_pred, a->qdd_pred += b->qdd_pred, a->force += b->force;
}

/* Gradient of one batch into slice_gradient[0]. */
static roln_status gradient(int acc, const roln_loss *weights, const roln_batch *batch, double dt)
{
    slice s[SLICES];
    pthread_t thread[SLICES];
    roln_real *sum = slice_gradient[0].theta;
    roln_status st = ROLN_OK;
    int k, i;
    for (k = 0; k < SLICES; k++) {
        const int from = batch->count * k / SLICES, to = batch->count * (k + 1) / SLICES;
        s[k].acc = acc, s[k].dt = dt, s[k].weights = *weights, s[k].batch = *batch;
        s[k].batch.start = batch->start + from, s[k].batch.count = to - from;
        s[k].gradient = &slice_gradient[k], s[k].work = &slice_work[k];
        if (k > 0 && pthread_create(&thread[k], NULL, run_slice, &s[k]) != 0) fail("no thread");
    }
    run_slice(&s[0]);
    for (k = 1; k < SLICES; k++)
        pthread_join(thread[k], NULL);
    for (k = 0; k < SLICES; k++) {
        if (s[k].status != ROLN_OK) st = s[k].status;
        if (k == 0) continue;
        for (i = 0; i < M(theta_size); i++)
            sum[i] += slice_gradient[k].theta[i];
        add(&slice_gradient[0].loss, &slice_gradient[k].loss);
        slice_gradient[0].windows += slice_gradient[k].windows;
    }
    return st;
}

/* E_q, E_qd at the end of windows of `samples` samples of d, in steps of `stride`; 1e9 where a roll-out fails or nothing
   moves. */
static void errors(const motion *d, const int *start, int count, int samples, int stride, double *eq, double *eqd)
{
    roln_error e[2], *last = samples > 0 ? e + 1 : e;
    const int steps = samples / stride;
    const roln_batch b = {
        .count = count, .steps = steps, .stride = stride, .start = start,
        .q = d->q, .qd = d->qd, .tau = set("torque") > 0 ? d->tau : NULL};
    const roln_status st =
        M(errors)(&params, &b, (roln_real)(d->dt * stride), steps > 0 ? steps : 1, qbar, e, &slice_work[0]);
    *eq = st == ROLN_OK && last->q_var > 0 ? sqrt((double)(last->q / last->q_var)) : 1e9;
    *eqd = st == ROLN_OK && last->qd_var > 0 ? sqrt((double)(last->qd / last->qd_var)) : 1e9;
}

/* Samples of a roll-out of `time` seconds in whole steps of `stride` samples; at least one step unless time is 0. */
static int span(const motion *d, double time, int stride)
{
    const int steps = (int)(time / d->dt / stride + 0.5);
    return time > 0 && steps < 1 ? stride : steps * stride;
}

/* Windows of `samples` samples on the trajectories from `from` on. */
static int held_windows(const motion *d, int from, int samples, int *start)
{
    const int count = windows(d, from, d->trajectories, samples, 100, 0, start);
    if (count == 0)
        fail("no held-out trajectory is as long as a validation roll-out, %g s: lower look or stride", samples * d->dt);
    return count;
}

/* E_q at their ends. */
static double validate(const motion *d, int from, int samples, int *start)
{
    const int count = held_windows(d, from, samples, start);
    double eq, eqd;
    errors(d, start, count, samples, (int)set("stride"), &eq, &eqd);
    return eq;
}

enum { AUTOENCODER, ACCELERATION, ODE, STAGES };
static const struct {
    const char *name, *updates, *batch;
} stages[STAGES] = {{"autoencoder", "ae", "ae_batch"}, {"acceleration loss", "acc", "batch"}, {"ODE loss", "ode", "batch"}};

/* Windows of a stage on the first `train` trajectories. */
static int stage_windows(const motion *d, int train, int kind, int *start)
{
    return windows(d, 0, train, kind == ACCELERATION ? 1 : kind == ODE ? (int)(set("steps") * set("stride")) : 0, 1,
                   kind == ACCELERATION, start);
}

/* What would stop a later stage, found before the first. */
static void check(const motion *d, int train)
{
    static const char *least_one[] = {"ae_batch", "batch", "steps", "stride"}, *least_zero[] = {"look", "noise", "smooth"};
    int *start, kind;
    size_t i;
    for (i = 0; i < sizeof least_one / sizeof *least_one; i++)
        if (!(set(least_one[i]) >= 1)) fail("%s=%g: at least 1", least_one[i], set(least_one[i]));
    if (train < 1 || train >= d->trajectories)
        fail("%d trajectories and held=%g: at least 1 to train with and 1 held out are needed", d->trajectories, set("held"));
    for (i = 0; i < sizeof least_zero / sizeof *least_zero; i++)
        if (set(least_zero[i]) < 0) fail("%s=%g: at least 0", least_zero[i], set(least_zero[i]));
    if (set("ode") > 0 && set("steps") > M(horizon))
        fail("steps=%g, but the windows of " STRING(MODEL) " have at most %d: raise ROLN_HORIZON", set("steps"), (int)M(horizon));
    start = room((size_t)d->samples * sizeof *start);
    for (kind = 0; kind < STAGES; kind++) {
        const int count = stage_windows(d, train, kind, start), size = (int)set(stages[kind].batch);
        if (set(stages[kind].updates) > 0 && count < size)
            fail("%s: %d windows in the data, but %s=%d", stages[kind].name, count, stages[kind].batch, size);
    }
    held_windows(d, train, span(d, set("look"), (int)set("stride")), start);
    held_windows(d, train, span(d, 0.025, (int)set("stride")), start);
    free(start);
}

/* What a stage minimises, before it is scaled. */
static roln_loss stage_weights(int kind)
{
    roln_loss w = {.q = (roln_real)set("w_q"), .qd = 1};
    if (kind == ACCELERATION) w.qdd = w.zdd = w.qdd_pred = (roln_real)set("w_acc"), w.force = (roln_real)set("w_force");
    if (kind == ODE) w.zd = w.qd_pred = 1, w.z = w.q_pred = set("positions") > 0 ? 1 : (roln_real)set("w_pos");
    return w;
}

/* One stage of training; ends with the parameters that predicted best, be it those that it began with. */
static void stage(const motion *d, int train, int kind)
{
    const int acc = kind == ACCELERATION;
    const int stride = kind == ODE ? (int)set("stride") : 1, steps = kind == ODE ? (int)set("steps") : 0;
    const int size = (int)set(stages[kind].batch), updates = (int)set(stages[kind].updates);
    int *start = room((size_t)d->samples * sizeof *start), *held = room((size_t)d->samples * sizeof *held);
    const int count = stage_windows(d, train, kind, start);
    const int look = kind == AUTOENCODER ? 0 : span(d, set("look"), (int)set("stride"));
    const int near = kind == AUTOENCODER ? 0 : span(d, 0.025, (int)set("stride"));
    const roln_real rate_ae = (roln_real)(kind == AUTOENCODER ? set("lr_ae") : set("lr_joint") * (kind == ODE ? set("ode_lr") : 1));
    const roln_real rate_net = (roln_real)(kind == AUTOENCODER ? 0 : set("lr_net") * (kind == ODE ? set("ode_lr") : 1));
    const double t0 = now();
    roln_batch b = {
        .count = size, .steps = steps, .stride = stride, .q = d->q, .qd = d->qd, .qdd = d->qdd,
        .tau = set("torque") > 0 ? (acc ? d->tau_mid : d->tau) : NULL};
    roln_loss w = stage_weights(kind), loss = {0};
    uint64_t seed = (uint64_t)set("seed") + 1000 * (uint64_t)(kind + 1);
    double seen = 0, best_error;
    int at = count, t, refused = 0;
    if (kind == ODE && set("positions") > 0) b.qd = NULL;
    if (set("scaled") > 0) {
        roln_loss var;
        roln_batch all = b;
        all.count = count, all.steps = 0, all.start = start;
        if (M(variance)(&params, &all, &var, &slice_work[0]) != ROLN_OK) fail("data without variance");
        roln_loss_divide(&w, &var);
    }
    memset(&optimiser, 0, sizeof optimiser);
    best = params, best_error = validate(d, train, look, held);
    printf("%s: %d windows, %d updates from E_q(%.4g ms) %.2f %%\n", stages[kind].name, count, updates, 1e3 * look * d->dt,
           100 * best_error);
    for (t = 0; t < updates; t++) {
        const roln_real rate = roln_schedule((uint32_t)t, 100, (uint32_t)updates, (roln_real)set("fall"));
        roln_opt opt = ROLN_OPT(rate * rate_ae, rate * rate_net);
        roln_status st;
        opt.lr[2] *= (roln_real)set("bias");
        opt.decay = (roln_real)set("decay"), opt.clip = (roln_real)set("clip");
        if (at + size > count) roln_shuffle(count, start, &seed), at = 0;
        b.start = start + at, at += size;
        st = gradient(acc, &w, &b, d->dt * stride);
        if (st == ROLN_OK) st = M(update)(&params, &opt, &optimiser, &slice_gradient[0], &slice_work[0]);
        if (st == ROLN_OK) add(&loss, &slice_gradient[0].loss), seen += (double)slice_gradient[0].windows;
        else if (++refused > 1000) fail("too many refused updates (status %d)", (int)st);
        if ((t + 1) % (updates >= 20 ? updates / 20 : 1) == 0) {
            const double e = validate(d, train, look, held), e_near = near == look ? e : validate(d, train, near, held);
            printf("%7d  loss %.2e (q %.1e)  E_q(%.4g ms) %6.2f %%  E_q(%.4g s) %6.2f %%  refused %d  %.0f s, %.0f s left\n", t + 1,
                   (double)roln_loss_total(&w, &loss) / seen, (double)loss.q / seen, 1e3 * near * d->dt, 100 * e_near,
                   look * d->dt, 100 * e, refused, now() - t0, (now() - t0) * (updates - t - 1) / (t + 1));
            fflush(stdout);
            memset(&loss, 0, sizeof loss);
            seen = 0;
            if (e < best_error) best_error = e, best = params;
        }
    }
    params = best;
    free(start);
    free(held);
}

static void put_file(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

static void table(const char *name, const motion *d, int from, int to)
{
    static const double ms[] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2999};
    const int every = span(d, 0.025, 1);
    int *start = room((size_t)d->samples * sizeof *start), last = -1;
    size_t i;
    printf("%s\n   ms    E_q %%   E_qd %%\n", name);
    for (i = 0; i < sizeof ms / sizeof *ms; i++) {
        const int samples = (int)(ms[i] * 1e-3 / d->dt + 0.5), count = windows(d, from, to, samples, every, 0, start);
        double eq, eqd;
        if (count == 0 || samples == last) continue;
        last = samples;
        errors(d, start, count, samples, 1, &eq, &eqd);
        printf("%5.4g %8.3f %8.3f\n", 1e3 * samples * d->dt, 100 * eq, 100 * eqd);
    }
    free(start);
}

/* The arguments key=value, from the third on. */
static void read_settings(int argc, char **argv, const char **out, const char **test)
{
    int i;
    for (i = 2; i < argc; i++) {
        char *eq = strchr(argv[i], '=');
        size_t k, known = 0;
        if (!eq) fail("%s: not key=value", argv[i]);
        *eq = 0;
        if (strcmp(argv[i], "out") == 0) *out = eq + 1, known = 1;
        if (strcmp(argv[i], "test") == 0) *test = eq + 1, known = 1;
        for (k = 0; k < sizeof settings / sizeof *settings; k++)
            if (strcmp(settings[k].key, argv[i]) == 0) {
                char *end;
                settings[k].value = strtod(eq + 1, &end), known = 1;
                if (end == eq + 1 || *end || !isfinite(settings[k].value)) fail("%s=%s: not a number", argv[i], eq + 1);
            }
        if (!known) fail("unknown setting %s", argv[i]);
    }
}

int main(int argc, char **argv)
{
    static unsigned char bytes[M(packed_size)];
    const char *out = STRING(MODEL), *test = NULL;
    const double began = now();
    uint64_t seed;
    motion d, unseen = {0};
    char path[512];
    FILE *f;
    int i, train;
    if (argc < 2) fail("usage: train motion.csv [test=FILE] [out=PREFIX] [key=value ...]");
    read_settings(argc, argv, &out, &test);
    d = read_csv(argv[1]);
    if (test) unseen = read_csv(test);
    train = d.trajectories - (int)ceil(d.trajectories * set("held"));
    check(&d, train);
    printf("%d trajectories (%d held out), %d samples of %g s, N = %d, n = %d, %d parameters\n", d.trajectories,
           d.trajectories - train, d.samples, d.dt, (int)M(N), (int)M(n), (int)M(theta_size));
    if (set("noise") > 0) /* after `unseen` was read, which stays as it is */
        printf("noise of standard deviation %.3g added to q\n", add_noise(&d, set("noise"), (uint64_t)set("seed") + 5000));
    if (set("smooth") >= 1) {
        printf("q, qd, qdd smoothed over %d samples\n", 2 * (int)set("smooth") + 1);
        smooth(&d, (int)set("smooth"));
    }
    seed = (uint64_t)set("seed");
    if (M(init_pod)(&params, d.first[train], d.q, d.qd, qbar, &seed, &start_work) != ROLN_OK)
        fail("no start from this data: it does not move, or its numbers are too large");
    snprintf(path, sizeof path, "%s.roln", out);
    f = fopen(path, "ab"); /* now rather than after the training */
    if (!f) fail("cannot write %s", path);
    fclose(f);
    if (set("from") > 0) {
        f = fopen(path, "rb");
        if (!f || M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &params) != ROLN_OK)
            fail("cannot start from %s", path);
        fclose(f);
    }
    params.dt = (roln_real)(d.dt * set("stride"));
    for (i = 0; i < STAGES; i++)
        if (set(stages[i].updates) >= 1) stage(&d, train, i);
    {
        static M(work) work;
        if (M(fit_range)(&params, d.first[train], d.q, d.qd, &work) != ROLN_OK) fail("no range");
    }
    M(pack)(&params, bytes);
    f = fopen(path, "wb");
    if (!f || fwrite(bytes, 1, sizeof bytes, f) != sizeof bytes || fclose(f) != 0) fail("cannot write %s", path);
    snprintf(path, sizeof path, "%s_weights.h", out);
    f = fopen(path, "w");
    if (!f || M(write)(&params, put_file, f) != ROLN_OK || ferror(f) || fclose(f) != 0) fail("cannot write %s", path);
    printf("wrote %s.roln and %s_weights.h after %.0f s\n", out, out, now() - began);
    table(set("noise") > 0 || set("smooth") >= 1 ? "held-out trajectories, altered as above" : "held-out trajectories", &d, train,
          d.trajectories);
    if (test) table(test, &unseen, 0, unseen.trajectories);
    return 0;
}
