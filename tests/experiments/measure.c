/* SPDX-License-Identifier: MIT */
/* measure.c - errors of a model on recorded motion. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

enum { EVERY = 25, LONG = 100 }; /* samples between the starts of windows, of those longer than LONG samples */

struct sums {
    double q, q_var, qd, qd_var, qdd, qdd_var;
    long windows, failed;
    double *each; /* |q_pred - q|^2 of each window, those of its samples added; NULL: not wanted */
    int count;    /* of these */
};

struct rollout {
    const struct predictor *p;
    const struct motion *d;
    roln_real *s, *next, *q, *qd, *qdd; /* state; decoded */
    int failed;
};

static const roln_real *at(const struct motion *d, const roln_real *x, int sample)
{
    return x ? x + (size_t)sample * (size_t)d->N : NULL;
}

static void begin(struct rollout *r, int sample)
{
    memset(r->s, 0, (size_t)r->p->state * sizeof *r->s);
    r->failed = r->p->encode(r->p->self, at(r->d, r->d->q, sample), at(r->d, r->d->qd, sample), r->s) != ROLN_OK;
}

/* One sample on; after a failure the state stays. */
static void advance(struct rollout *r, int sample)
{
    if (r->failed) return;
    memcpy(r->next, r->s, (size_t)r->p->state * sizeof *r->s);
    r->failed = r->p->step(r->p->self, r->next, at(r->d, r->d->tau, sample), r->d->dt) != ROLN_OK;
    if (!r->failed) memcpy(r->s, r->next, (size_t)r->p->state * sizeof *r->s);
}

static void compare(struct rollout *r, int sample, struct sums *e)
{
    const struct motion *d = r->d;
    const roln_real *q = at(d, d->q, sample), *qd = at(d, d->qd, sample), *qdd = at(d, d->qdd, sample);
    const int inside = sample % d->samples != 0 && (sample + 1) % d->samples != 0; /* else qdd is a one-sided difference */
    if (r->p->decode(r->p->self, r->s, r->q, r->qd) != ROLN_OK) r->failed = 1;     /* the decoded sample before stays */
    if (inside && r->p->accelerate(r->p->self, r->q, r->qd, at(d, d->tau_mid, sample), r->qdd) != ROLN_OK) r->failed = 1;
    for (int i = 0; i < d->N; i++) {
        const double x = (double)(r->q[i] - q[i]), c = (double)(q[i] - d->mean[i]), v = (double)(r->qd[i] - qd[i]);
        e->q += x * x, e->q_var += c * c, e->qd += v * v, e->qd_var += (double)(qd[i] * qd[i]);
        if (e->each) e->each[e->count - 1] += x * x;
        const double a = inside ? (double)(r->qdd[i] - qdd[i]) : 0;
        e->qdd += a * a, e->qdd_var += inside ? (double)(qdd[i] * qdd[i]) : 0;
    }
    e->windows++, e->failed += r->failed;
}

static int smaller(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* E_q_median, E_q_90: what half of the windows, and nine in ten, stay below, in the measure of E_q. */
static void print(FILE *out, const char *horizon, const struct sums *e)
{
    if (e->windows == 0) return;
    fprintf(out, "E_q %s %.5g\n", horizon, 100 * sqrt(e->q / e->q_var));
    if (e->each) {
        const double unit = e->q_var / e->count;
        qsort(e->each, (size_t)e->count, sizeof *e->each, smaller);
        fprintf(out, "E_q_median %s %.5g\n", horizon, 100 * sqrt(e->each[(e->count - 1) / 2] / unit));
        fprintf(out, "E_q_90 %s %.5g\n", horizon, 100 * sqrt(e->each[(9 * e->count - 1) / 10] / unit));
    }
    fprintf(out, "E_qd %s %.5g\n", horizon, 100 * sqrt(e->qd / e->qd_var));
    fprintf(out, "E_qdd %s %.5g\n", horizon, 100 * sqrt(e->qdd / e->qdd_var));
    if (e->failed) fprintf(out, "failed %s %.3g\n", horizon, 100 * (double)e->failed / (double)e->windows);
}

/* Windows: one roll-out from every start serves all horizons that fit into its trajectory. */
static void windows(struct rollout *r, const int *ms, int horizons, FILE *out)
{
    const struct motion *d = r->d;
    const size_t most = (size_t)(d->count * (d->samples / EVERY + 1));
    struct sums *e = calloc((size_t)horizons, sizeof *e);
    double *each = calloc((size_t)horizons * most, sizeof *each);
    if (!e || !each) exit(1);
    for (int h = 0; h < horizons; h++)
        e[h].each = each + (size_t)h * most;
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i < d->samples; i += EVERY) {
            begin(r, k * d->samples + i);
            for (int t = 0, h = 0; h < horizons; t++) {
                const int last = (int)(ms[h] * 1e-3 / d->dt + 0.5);
                if (i + last >= d->samples || (last > LONG && i % LONG != 0)) break;
                if (t == last) e[h].count++, compare(r, k * d->samples + i + t, &e[h++]);
                advance(r, k * d->samples + i + t);
            }
        }
    for (int h = 0; h < horizons; h++) {
        char name[16];
        snprintf(name, sizeof name, "%d", ms[h]);
        print(out, name, &e[h]);
    }
    free(e), free(each);
}

/* Largest |E - E(0) - work| of a trajectory so far, and largest T. */
struct balance {
    double E0, off, top;
};

static void weigh(struct balance *b, int first, double T, double V, double work)
{
    if (first) b->E0 = T + V, b->off = b->top = 0;
    b->top = fmax(b->top, T);
    b->off = fmax(b->off, fabs(T + V - b->E0 - work));
}

/* Whole trajectories: errors; drift of the model's own energy and of MuJoCo's along the prediction. Forces do the work
   sum tau (q_pred' - q_pred). */
static int whole(struct rollout *r, FILE *out)
{
    const struct motion *d = r->d;
    const size_t N = (size_t)d->N;
    struct sums e = {.each = calloc((size_t)d->count, sizeof *e.each)};
    roln_real *before = calloc(N, sizeof *before);
    double *q = calloc(2 * N, sizeof *q), own = 0, real = 0;
    int bad = !before || !q || !e.each;
    for (int k = 0; k < d->count && !bad; k++) {
        struct balance a = {0, 0, 0}, b = {0, 0, 0};
        double work = 0, T = 0, V = 0;
        begin(r, k * d->samples), e.count++;
        for (int t = 0; t < d->samples && !bad; t++) {
            const int sample = k * d->samples + t;
            if (t > 0) memcpy(before, r->q, N * sizeof *before);
            compare(r, sample, &e);
            for (size_t i = 0; i < N; i++) {
                if (t > 0 && d->tau) work += (double)(at(d, d->tau, sample - 1)[i] * (r->q[i] - before[i]));
                q[i] = (double)r->q[i], q[N + i] = (double)r->qd[i];
            }
            if (r->p->energy) r->p->energy(r->p->self, r->s, &T, &V), weigh(&a, t == 0, T, V, work);
            bad = truth_energy(d->system, q, q + N, &T, &V) != 0;
            weigh(&b, t == 0, T, V, work * d->force);
            advance(r, sample);
        }
        own = fmax(own, a.off / a.top), real = fmax(real, b.off / b.top);
    }
    print(out, "whole", &e);
    if (r->p->energy) fprintf(out, "drift own %.4g\n", 100 * own);
    fprintf(out, "drift true %.4g\n", 100 * real);
    free(before), free(q), free(e.each);
    return bad ? -1 : 0;
}

static void trivial(const struct motion *d, int ms, FILE *out)
{
    double e = 0, var = 0;
    const int h = (int)(ms * 1e-3 / d->dt + 0.5);
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i + h < d->samples; i += EVERY)
            for (int j = 0; j < d->N; j++) {
                const size_t a = (size_t)((k * d->samples + i) * d->N + j), b = a + (size_t)(h * d->N);
                const double x = (double)(d->q[a] - d->q[b]) + ms * 1e-3 * (double)d->qd[a], c = (double)(d->q[b] - d->mean[j]);
                e += x * x, var += c * c;
            }
    fprintf(out, "trivial %d %.5g\n", ms, 100 * sqrt(e / var));
}

/* Microseconds of a step of h seconds, an encoding and a decoding: the least of ten measurements. */
static void timing(struct rollout *r, double h, FILE *out)
{
    enum { RUNS = 10, CALLS = 200 };
    const struct predictor *p = r->p;
    double best[3] = {1e9, 1e9, 1e9};
    static const char *const names[3] = {"step", "encode", "decode"};
    for (int run = 0; run < RUNS; run++)
        for (int what = 0; what < 3; what++) {
            begin(r, 0);
            const double t0 = cpu_seconds();
            for (int i = 0; i < CALLS; i++) {
                if (what == 0) p->step(p->self, r->s, NULL, h);
                if (what == 1) p->encode(p->self, r->d->q, r->d->qd, r->s);
                if (what == 2) p->decode(p->self, r->s, r->q, r->qd);
            }
            best[what] = fmin(best[what], 1e6 * (cpu_seconds() - t0) / CALLS);
        }
    for (int what = 0; what < 3; what++)
        fprintf(out, "us %s %.4g\n", names[what], best[what]);
}

static int rollout_init(struct rollout *r, const struct predictor *p, const struct motion *d)
{
    const size_t N = (size_t)d->N, n = (size_t)p->state;
    const struct rollout new = {p, d, calloc(2 * n + 3 * N, sizeof *r->s), NULL, NULL, NULL, NULL, 0};
    *r = new;
    if (!r->s) return -1;
    r->next = r->s + n, r->q = r->next + n, r->qd = r->q + N, r->qdd = r->qd + N;
    return 0;
}

int measure(const struct predictor *p, const struct motion *d, const int *ms, int horizons, FILE *out)
{
    struct rollout r;
    int bad;
    if (rollout_init(&r, p, d) != 0) return -1;
    windows(&r, ms, horizons, out);
    bad = whole(&r, out);
    for (int h = 0; h < horizons; h++)
        if (ms[h] > 0 && ms[h] * 1e-3 < (d->samples - 1) * d->dt) trivial(d, ms[h], out);
    timing(&r, d->dt, out);
    free(r.s);
    return bad;
}

int measure_chart(const struct predictor *p, const struct motion *d, FILE *out)
{
    static const int now = 0;
    struct rollout r;
    if (rollout_init(&r, p, d) != 0) return -1;
    windows(&r, &now, 1, out);
    free(r.s);
    return 0;
}

/* Beads of one instant, mm. */
static void path_line(const struct motion *d, const char *whose, int t, const roln_real *q, int beads, double *room, FILE *out)
{
    double *xyz = room + d->N;
    for (int i = 0; i < d->N; i++)
        room[i] = (double)q[i];
    truth_beads(d->system, room, xyz);
    fprintf(out, "path %s %.0f", whose, 1e3 * t * d->dt);
    for (int i = 0; i < 3 * beads; i++)
        fprintf(out, " %.0f", round(1e3 * xyz[i]) + 0.); /* no -0 */
    fprintf(out, "\n");
}

int measure_path(const struct predictor *p, const struct motion *d, FILE *out)
{
    struct rollout r;
    struct sums e = {.windows = 0};
    int columns, rows;
    if (truth_grid(d->system, &columns, &rows) != 0) return -1;
    const int beads = columns * rows, last = d->samples - 1;
    double *room = calloc((size_t)(d->N + 3 * beads), sizeof *room);
    const int bad = rollout_init(&r, p, d) != 0 || !room;
    if (!bad) begin(&r, 0);
    for (int t = 0, shown = 0; t <= last && !bad; t++) {
        if (t == last * shown / 4) {
            compare(&r, t, &e);
            path_line(d, "true", t, at(d, d->q, t), beads, room, out), path_line(d, "predicted", t, r.q, beads, room, out);
            shown++;
        }
        advance(&r, t);
    }
    free(room), free(r.s);
    return bad ? -1 : 0;
}
