/* SPDX-License-Identifier: MIT */
/* speed.c - MuJoCo's full system against the reduced model, one thread, in one run: build/speed DIR prints lines
   `key system value`; microseconds, milliseconds, per cent. Weights are those of the run list in DIR; of a system whose weights
   are not there yet it says `missing system RUN`, and no more. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "recipes.h"

enum { SEED = 1, EVERY = 25 };
enum { RUNS = 15, STEPS = 3000, PIECE = 50 };   /* timings: at least so many runs and steps, a piece of steps at a time */

static const struct entry {
    const char *name;
    enum truth_system full, reduced;    /* what MuJoCo steps; what the model predicts */
    const char *runs[3];                /* weights: the first that exists */
} entries[] = {
    {"pend2", TRUTH_PEND2, TRUTH_PEND2, {"pend2-exp-1"}},
    {"pend16", TRUTH_PEND16_SOFT, TRUTH_PEND16, {"pend16-1200-ro-1", "pend16-300-ro-1", "pend16-ro-1"}},
    {"pend16_paper", TRUTH_PEND16_SOFT, TRUTH_PEND16, {"pend16-300-paper-1", "pend16-paper-1"}},
    {"wave16", TRUTH_WAVE16_SOFT, TRUTH_WAVE16, {"wave16-300-ro-1", "wave16-ro-1"}},
    {"rope", TRUTH_ROPE, TRUTH_ROPE, {"rope-n10-1"}},
    {"cloth_given", TRUTH_CLOTH, TRUTH_CLOTH, {"cloth-n10-1"}},
    {"cloth", TRUTH_CLOTH, TRUTH_CLOTH, {"cloth-free-n10-1"}},
};
enum { ENTRIES = sizeof entries / sizeof *entries };

/* Steps of MuJoCo in 0.1 ms, of the model in ms, longest first. */
static const int full_steps[] = {1000, 800, 600, 500, 400, 300, 250, 200, 150, 120, 100, 80,
                                  60, 50, 40, 30, 25, 20, 15, 12, 10, 8, 6, 5, 4, 3, 2, 1};
static const int reduced_steps[] = {100, 50, 25, 20, 10, 5, 2, 1};

/* `prefix` tells the model at steps of 1 ms from the model at its largest stable one. */
static void put(const struct entry *e, const char *prefix, const char *key, double x)
{
    printf("%s%s %s %.6g\n", prefix, key, e->name, x);
}

/* ---- prediction ---- */

struct task {
    struct model model;
    struct predictor p;
    struct motion d;
    roln_real *s, *next, *force;        /* state, state under way, mean force of a step */
};

static void *room(size_t count)
{
    void *p = calloc(count, sizeof(roln_real));
    if (!p) fprintf(stderr, "speed: out of memory\n"), exit(1);
    return p;
}

/* Mean force of h samples; NULL: none. */
static const roln_real *force_of(const struct task *k, int sample, int h, roln_real *mean)
{
    const struct motion *d = &k->d;
    if (!d->tau) return NULL;
    for (int j = 0; j < d->N; j++) {
        double sum = 0;
        for (int i = sample; i < sample + h; i++)
            sum += (double)d->tau[(size_t)i * (size_t)d->N + (size_t)j];
        mean[j] = (roln_real)(sum / h);
    }
    return mean;
}

static int begin(struct task *k, int sample)
{
    const size_t row = (size_t)sample * (size_t)k->d.N;
    return k->p.encode(k->p.self, k->d.q + row, k->d.qd + row, k->s) != ROLN_OK;
}

/* From one sample `count` on, in steps of h samples, the last one shorter if need be. After a failure the state stays. */
static int advance(struct task *k, int sample, int count, int h)
{
    for (int i = 0; i < count; i += h) {
        const int now = count - i < h ? count - i : h;
        memcpy(k->next, k->s, (size_t)k->p.state * sizeof *k->s);
        if (k->p.step(k->p.self, k->next, force_of(k, sample + i, now, k->force), now * k->d.dt) != ROLN_OK) return 1;
        memcpy(k->s, k->next, (size_t)k->p.state * sizeof *k->s);
    }
    return 0;
}

/* Whole trajectories in steps of h samples; q at the ends of steps. Returns the number of trajectories that failed. */
static int predict(struct task *k, int h, roln_real *q)
{
    const struct motion *d = &k->d;
    roln_real *qd = room((size_t)d->N);
    int failures = 0;
    for (int t = 0; t < d->count; t++) {
        int failed = begin(k, t * d->samples);
        for (int i = 0; i < d->samples; i += h) {
            const int sample = t * d->samples + i;
            failed |= k->p.decode(k->p.self, k->s, q + (size_t)sample * (size_t)d->N, qd) != ROLN_OK;
            if (!failed && i + h < d->samples) failed = advance(k, sample, h, h);
        }
        failures += failed;
    }
    free(qd);
    return failures;
}

/* sqrt(sum |a - b|^2 / sum |b - mean|^2) over every h-th sample, percent. */
static double relative(const struct motion *d, const roln_real *a, const roln_real *b, int h)
{
    double e = 0, var = 0;
    for (int t = 0; t < d->count; t++)
        for (int i = 0; i < d->samples; i += h)
            for (int j = 0; j < d->N; j++) {
                const size_t at = (size_t)(t * d->samples + i) * (size_t)d->N + (size_t)j;
                const double x = (double)(a[at] - b[at]), c = (double)(b[at] - d->mean[j]);
                e += x * x, var += c * c;
            }
    return 100 * sqrt(e / var);
}

/* E_q at the end of windows of 25 ms, percent. */
static double window_error(struct task *k, int h)
{
    const struct motion *d = &k->d;
    const size_t N = (size_t)d->N;
    roln_real *x = room(2 * N);
    double e = 0, var = 0;
    for (int t = 0; t < d->count; t++)
        for (int i = 0; i + EVERY < d->samples; i += EVERY) {
            const int sample = t * d->samples + i;
            const roln_real *q = d->q + (size_t)(sample + EVERY) * N;
            if (begin(k, sample) == 0) advance(k, sample, EVERY, h);
            k->p.decode(k->p.self, k->s, x, x + N);
            for (size_t j = 0; j < N; j++) {
                const double off = (double)(x[j] - q[j]), c = (double)(q[j] - d->mean[j]);
                e += off * off, var += c * c;
            }
        }
    free(x);
    return 100 * sqrt(e / var);
}

/* ---- time: the least of many runs, piece by piece, as in truth_time ---- */

static double now(void) /* microseconds */
{
    return 1e6 * cpu_seconds();
}

static double encode_time(struct task *k)
{
    double least = HUGE_VAL;
    for (int run = 0; run < 10 * RUNS; run++) {
        const double t0 = now();
        for (int i = 0; i < PIECE; i++)
            begin(k, i);
        least = fmin(least, (now() - t0) / PIECE);
    }
    return least;
}

static double decode_time(struct task *k)
{
    roln_real *x = room(2 * (size_t)k->d.N);
    double least = HUGE_VAL;
    begin(k, 0);
    for (int run = 0; run < 10 * RUNS; run++) {
        const double t0 = now();
        for (int i = 0; i < PIECE; i++)
            k->p.decode(k->p.self, k->s, x, x + k->d.N);
        least = fmin(least, (now() - t0) / PIECE);
    }
    free(x);
    return least;
}

/* Microseconds per step of h samples along the first trajectory; decode: with a decoding after every step. */
static double step_time(struct task *k, int h, int decode)
{
    const size_t N = (size_t)k->d.N;
    const int steps = (k->d.samples - 1) / h;
    roln_real *x = room(2 * N), *force = room((size_t)steps * N);
    double sum = 0, *least = malloc((size_t)steps * sizeof *least);
    if (!least) exit(1);
    for (int i = 0; i < steps; i++)
        force_of(k, i * h, h, force + (size_t)i * N), least[i] = HUGE_VAL;
    for (int run = 0; run < RUNS || run * steps < STEPS; run++) {
        begin(k, 0);
        for (int a = 0; a < steps; a += PIECE) {
            const double t0 = now();
            for (int i = a; i < steps && i < a + PIECE; i++) {
                k->p.step(k->p.self, k->s, k->d.tau ? force + (size_t)i * N : NULL, h * k->d.dt);
                if (decode) k->p.decode(k->p.self, k->s, x, x + N);
            }
            least[a] = fmin(least[a], now() - t0);
        }
    }
    for (int a = 0; a < steps; a += PIECE)
        sum += least[a];
    free(x), free(force), free(least);
    return sum / steps;
}

/* The same of 16 roll-outs together, each: as NAME_errors does it. They start 5 ms apart. */
static double block_time(struct task *k, int h)
{
    const struct config *kind = k->model.kind;
    const roln_scale *sc = k->model.sc;
    const roln_real *tau;
    const int N = kind->N, n = kind->n, m = BLOCK * n;
    roln_real *s0 = room((size_t)(2 * m + N * BLOCK)), *ts = s0 + 2 * m;
    double least = HUGE_VAL;
    for (int r = 0; r < BLOCK; r++) {
        begin(k, 5 * r);
        if ((tau = force_of(k, 5 * r, h, k->force)) != NULL)
            for (int j = 0; j < N; j++)
                ts[r * N + j] = tau[j] * rolni_force_unit(sc);
        for (int i = 0; i < n; i++)
            s0[r * n + i] = k->s[i], s0[m + r * n + i] = k->s[n + i] * sc->t;
    }
    for (int run = 0; run < 10 * RUNS; run++) {
        const double t0 = now();
        kind->block(k->model.self, s0, k->d.tau ? ts : NULL, h * k->d.dt, 5);
        least = fmin(least, (now() - t0) / (5 * BLOCK));
    }
    free(s0);
    return least;
}

/* ---- one system ---- */

/* Of a step of MuJoCo at its own step and at the largest stable one. */
static int time_full(const struct entry *e)
{
    struct truth_set s;
    double us, error;
    int i = 0;
    if (truth_generate(&s, e->full, TRUTH_TEST, SEED, 0, TESTS, truth_samples(e->full)) != 0 ||
        truth_time(&s, s.dt_sim, &us, &error) != 0) return -1;
    printf("integrator %s %s\n", e->name, e->full == TRUTH_CLOTH ? "Euler" : "RK4");
    put(e, "full_", "ms", 1e3 * s.dt_sim);
    put(e, "full_", "us", us);
    while (1e-4 * full_steps[i] > s.dt_sim * 1.0001 && (truth_time(&s, 1e-4 * full_steps[i], NULL, &error) != 0 || error > .05))
        i++;
    const double dt = 1e-4 * full_steps[i];
    if (truth_time(&s, dt, &us, &error) != 0) return -1;
    put(e, "full_stable_", "ms", 1e3 * dt);
    put(e, "full_stable_", "off", 100 * error);
    put(e, "full_stable_", "us", us);
    truth_free(&s);
    return 0;
}

/* The model in steps of h samples, q as predicted by it: errors, and microseconds per simulated ms. */
static void put_reduced(struct task *k, const struct entry *e, const char *prefix, int h, const roln_real *q)
{
    const double ms = 1e3 * h * k->d.dt, whole = 1e3 * (k->d.samples - 1) * k->d.dt;
    put(e, prefix, "ms", ms);
    put(e, prefix, "E_q_25", window_error(k, h));
    put(e, prefix, "E_q_whole", relative(&k->d, q, k->d.q, h));
    put(e, prefix, "latent", step_time(k, h, 0) / ms);
    put(e, prefix, "decoded", step_time(k, h, 1) / ms + encode_time(k) / whole);
    put(e, prefix, "block", block_time(k, h) / ms);
}

static void time_reduced(struct task *k, const struct entry *e)
{
    const struct motion *d = &k->d;
    const size_t size = (size_t)d->count * (size_t)d->samples * (size_t)d->N;
    roln_real *own = room(size), *q = room(size);
    int i = 0;
    predict(k, 1, own);
    while (reduced_steps[i] > 1 && (predict(k, reduced_steps[i], q) > 0 || !(relative(d, q, own, reduced_steps[i]) <= 1)))
        i++;
    const int h = reduced_steps[i];
    predict(k, h, q);
    put(e, "", "encode", encode_time(k));
    put(e, "", "decode", decode_time(k));
    put_reduced(k, e, "model_", 1, own);
    put_reduced(k, e, "model_stable_", h, q);
    put(e, "model_stable_", "off", relative(d, q, own, h));
    free(own), free(q);
}

/* The test motion, relative to the mean of the training. */
static int recorded(struct motion *test, const struct entry *e, const struct recipe *r)
{
    struct motion train;
    const double force = r->system == e->reduced ? r->force : 0;
    if (motion_simulate(&train, r->system, TRUTH_TRAIN, 0, r->train, 0, NULL) != 0) return -1;
    const int bad = motion_simulate(test, e->reduced, TRUTH_TEST, 0, TESTS, force, train.mean);
    motion_free(&train);
    return bad;
}

static int measure_entry(const struct entry *e, const struct recipe *r, const char *run, const char *path)
{
    struct task k;
    if (model_load(&k.model, recipe_weights(r), path) != 0 || recorded(&k.d, e, r) != 0) return -1;
    k.p = model_predictor(&k.model);
    k.s = room((size_t)k.p.state), k.next = room((size_t)k.p.state), k.force = room((size_t)k.d.N);
    printf("weights %s %s\n", e->name, run);
    put(e, "", "joints", k.d.N);
    put(e, "", "coordinates", k.model.kind->n);
    const int bad = time_full(e);
    if (!bad) time_reduced(&k, e);
    free(k.s), free(k.next), free(k.force);
    motion_free(&k.d), model_free(&k.model);
    return bad;
}

/* The first run of the entry whose weights exist; NULL: none. */
static const struct recipe *weights_of(const struct entry *e, const char *dir, const char **run, char path[512])
{
    for (int i = 0; i < 3 && e->runs[i]; i++) {
        int seed;
        const struct recipe *r = recipe_of_run(e->runs[i], &seed);
        snprintf(path, 512, "%s/%s.roln", dir, *run = e->runs[i]);
        FILE *f = r ? fopen(path, "rb") : NULL;
        if (f) return fclose(f), r;
    }
    return NULL;
}

int main(int argc, char **argv)
{
    char path[512];
    const char *run;
    if (argc != 2) return fprintf(stderr, "usage: speed DIR\n"), 2;
    for (int i = 0; i < ENTRIES; i++) {
        const struct recipe *r = weights_of(&entries[i], argv[1], &run, path);
        if (!r) printf("missing %s %s\n", entries[i].name, entries[i].runs[0]);
        else if (measure_entry(&entries[i], r, run, path) != 0) return 1;
    }
    return 0;
}
