/* SPDX-License-Identifier: MIT */
/* baseline.c - the models of latent.c under the autoencoder of a trained model: rows for Gauss-Newton as RO-LNN has them, from the
   same samples and windows, and roll-outs. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

enum { H_MAX = 50 }; /* steps of a window */

/* ---- motion in the latent space, in its units ---- */

struct encoded {
    const struct motion *d;
    struct model *m;
    int n;
    roln_real *s, *zdd, *tau_z; /* [samples][2n] z, zd; [n]; tau_z is that of the accelerations, NULL: none */
};

static void *room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (!p) fprintf(stderr, "baseline: out of memory\n"), exit(1);
    return p;
}

static int encode_all(struct encoded *e, struct model *m, const struct motion *d)
{
    const int n = m->kind->n, rows = d->count * d->samples;
    roln_real x[3 * LATENT_MOST], f[LATENT_MOST];
    e->d = d, e->m = m, e->n = n;
    e->s = room((size_t)rows * 2 * (size_t)n, sizeof *e->s), e->zdd = room((size_t)(rows * n), sizeof *e->s);
    e->tau_z = d->tau ? room((size_t)(rows * n), sizeof *e->s) : NULL;
    for (int i = 0; i < rows; i++) {
        const size_t row = (size_t)i * (size_t)d->N, at = (size_t)(i * n);
        if (model_latent(m, d->q + row, d->qd + row, d->qdd + row, d->tau ? d->tau_mid + row : NULL, x, f) != ROLN_OK) return -1;
        memcpy(e->s + 2 * at, x, (size_t)(2 * n) * sizeof *x), memcpy(e->zdd + at, x + 2 * n, (size_t)n * sizeof *x);
        if (d->tau) memcpy(e->tau_z + at, f, (size_t)n * sizeof *f);
    }
    return 0;
}

/* x [n] = J(z)^T xi in units of the networks, xi = +-1 at random: what an error of z, zd or zdd is in all coordinates. */
static void sketch(const struct encoded *e, const roln_real *z, uint64_t *signs, roln_real *x)
{
    const int N = e->m->kind->N;
    roln_real xi[1024];
    for (int j = 0; j < N; j++)
        xi[j] = roln_rand(signs) >> 63 ? ROLN_C(1.0) : ROLN_C(-1.0);
    if (e->m->kind->reduce(e->m->self, z, xi, x) != ROLN_OK) x[0] = ROLN_C(0.0) / ROLN_C(0.0);
    for (int i = 0; i < e->n; i++)
        x[i] /= e->m->sc->q;
}

/* tau_z [n] of the mean force of `stride` samples from i on; NULL: none. */
static const roln_real *held(const struct encoded *e, int i, int stride, roln_real *tau_z)
{
    const int N = e->d->N;
    roln_real mean[1024] = {0};
    if (!e->d->tau) return NULL;
    for (int k = 0; k < stride * N; k++)
        mean[k % N] += e->d->tau[(size_t)i * (size_t)N + (size_t)k] / (roln_real)stride;
    if (e->m->kind->reduce(e->m->self, e->s + 2 * i * e->n, mean, tau_z) != ROLN_OK) tau_z[0] = ROLN_C(0.0) / ROLN_C(0.0);
    for (int k = 0; k < e->n; k++)
        tau_z[k] *= e->m->sc->t * e->m->sc->t;
    return tau_z;
}

/* ---- RK4 ---- */

/* A step of h under tau_z; x [4][2n]: where the rate was taken. */
static roln_status rk4(const struct latent *m, int n, const roln_real *tau_z, roln_real h, const roln_real *s, roln_real *x,
                       roln_real *to)
{
    static const double c[4] = {0, .5, .5, 1}, w[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    roln_real k[2 * LATENT_MOST] = {0}, y[2 * LATENT_MOST];
    memcpy(y, s, (size_t)(2 * n) * sizeof *y);
    for (int j = 0; j < 4; j++, x += 2 * n) {
        for (int i = 0; i < 2 * n; i++)
            x[i] = s[i] + (roln_real)c[j] * h * k[i];
        const roln_status st = latent_rate(m, x, tau_z, k);
        if (st != ROLN_OK) return st;
        for (int i = 0; i < 2 * n; i++)
            y[i] += (roln_real)w[j] * h * k[i];
    }
    memcpy(to, y, (size_t)(2 * n) * sizeof *y);
    return ROLN_OK;
}

/* Backward: g [2n], cotangent of the end in, of the start out. */
static void rk4_bwd(const struct latent *m, int n, const roln_real *tau_z, roln_real h, const roln_real *x, roln_real *g,
                    roln_real *gtheta)
{
    static const double c[5] = {0, .5, .5, 1, 0}, w[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    roln_real u[2 * LATENT_MOST] = {0}, bar[2 * LATENT_MOST], sum[2 * LATENT_MOST];
    memcpy(sum, g, sizeof sum);
    for (int j = 3; j >= 0; j--) {
        for (int i = 0; i < 2 * n; i++)
            bar[i] = h * ((roln_real)w[j] * g[i] + (roln_real)c[j + 1] * u[i]);
        latent_bwd(m, x + 2 * j * n, tau_z, bar, u, gtheta);
        for (int i = 0; i < 2 * n; i++)
            sum[i] += u[i];
    }
    memcpy(g, sum, sizeof sum);
}

/* ---- rows ---- */

struct rows {
    struct newton_task task;
    struct encoded e;
    struct latent *m;
    const struct stage *s;
    struct picks picks;
    double *samples;
};

/* The number xi . J (model - data) of s' at a sample, xi random signs, and its gradient. */
static roln_real single(struct rows *w, int i, uint64_t signs, roln_real *gtheta)
{
    const struct encoded *e = &w->e;
    const int n = e->n;
    const roln_real *s = e->s + 2 * i * n, *tau = e->tau_z ? e->tau_z + i * n : NULL;
    roln_real bar[2 * LATENT_MOST], sd[2 * LATENT_MOST], rate[2 * LATENT_MOST], gs[2 * LATENT_MOST], r = 0;
    memcpy(sd, s + n, (size_t)n * sizeof *s), memcpy(sd + n, e->zdd + i * n, (size_t)n * sizeof *s);
    sketch(e, s, &signs, bar), sketch(e, s, &signs, bar + n);
    if (latent_rate(w->m, s, tau, rate) != ROLN_OK) return ROLN_C(0.0) / ROLN_C(0.0);
    for (int k = 0; k < 2 * n; k++)
        r += bar[k] * (rate[k] - sd[k]);
    if (gtheta) latent_bwd(w->m, s, tau, bar, gs, gtheta);
    return r + latent_extra(w->m, s, tau, sd, &signs, gtheta);
}

/* The same of z and zd in a window: all its steps, each a part of the whole. */
static roln_real window(struct rows *w, int from, uint64_t signs, roln_real *gtheta)
{
    const struct encoded *e = &w->e;
    const int n = e->n, H = w->s->steps, stride = w->s->stride;
    const roln_real h = (roln_real)(e->d->dt * stride) / e->m->sc->t, part = (roln_real)(w->picks.factor / sqrt(H));
    roln_real x[H_MAX][8 * LATENT_MOST], bar[H_MAX][2 * LATENT_MOST], tau[LATENT_MOST], s[2 * LATENT_MOST], r = 0;
    memcpy(s, e->s + 2 * from * n, (size_t)(2 * n) * sizeof *s);
    for (int k = 0; k < H; k++) {
        const roln_real *data = e->s + 2 * (from + (k + 1) * stride) * n;
        if (rk4(w->m, n, held(e, from + k * stride, stride, tau), h, s, x[k], s) != ROLN_OK) return ROLN_C(0.0) / ROLN_C(0.0);
        sketch(e, data, &signs, bar[k]), sketch(e, data, &signs, bar[k] + n);
        for (int i = 0; i < 2 * n; i++) {
            bar[k][i] *= i < n ? part : part * ROLN_SQRT(ROLN_C(0.1));
            r += bar[k][i] * (s[i] - data[i]);
        }
    }
    roln_real g[2 * LATENT_MOST] = {0};
    for (int k = H - 1; k >= 0 && gtheta; k--) {
        for (int i = 0; i < 2 * n; i++)
            g[i] += bar[k][i];
        rk4_bwd(w->m, n, held(e, from + k * stride, stride, tau), h, x[k], g, gtheta);
    }
    return r;
}

static void draw(void *self, int count, double share, uint64_t *seed)
{
    struct rows *w = self;
    picks_draw(&w->picks, count, share, seed);
}

static void rows(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r)
{
    struct rows *w = self;
    const int P = latent_params(w->m);
    roln_real *theta = latent_theta(w->m), *kept = room((size_t)P, sizeof *kept);
    memcpy(kept, theta, (size_t)P * sizeof *kept), memmove(theta, x, (size_t)P * sizeof *kept);
    for (int k = 0; k < count; k++) {
        const int at = w->picks.start[from + k], windows = w->picks.window[from + k];
        const uint64_t signs = w->picks.signs + (uint64_t)(from + k);
        roln_real *row = J ? J + (size_t)k * (size_t)P : NULL;
        if (row) memset(row, 0, (size_t)P * sizeof *row);
        r[k] = -(windows ? window : single)(w, at, signs, row);
        *w->samples += windows ? w->s->steps + 1 : 1;
    }
    memcpy(theta, kept, (size_t)P * sizeof *kept);
    free(kept);
}

void baseline_task_free(struct newton_task *task)
{
    struct rows *w = task->self;
    picks_close(&w->picks);
    free(w->e.s), free(w->e.zdd), free(w->e.tau_z), free(w);
}

struct newton_task *baseline_task(struct baseline *b, const struct motion *d, const struct stage *s, double *samples)
{
    struct rows *w = room(1, sizeof *w);
    w->task.self = w, w->task.draw = draw, w->task.rows = rows;
    w->m = b->latent, w->s = s, w->samples = samples;
    picks_open(&w->picks, d, s);
    if (s->steps <= H_MAX && encode_all(&w->e, b->model, d) == 0) return &w->task;
    baseline_task_free(&w->task);
    return NULL;
}

int baseline_train(struct baseline *b, enum latent_kind kind, const struct motion *d, const struct stage *s, double seconds,
                   uint64_t seed, double *samples)
{
    const double t0 = cpu_seconds();
    const struct model *m = b->model;
    if (!b->latent) b->latent = latent_new(kind, m->kind->n, d->tau != NULL, m->kind->md->ae.monomials > 0 ? 4 : 1, seed);
    if (!b->latent) return fprintf(stderr, "baseline: no such model\n"), -1;
    const int P = latent_params(b->latent);
    const roln_block block = {ROLN_EUCLIDEAN, P, 1, 1};
    struct newton_task *task = baseline_task(b, d, s, samples);
    if (!task) return fprintf(stderr, "baseline: no latent motion\n"), -1;
    struct rows *w = task->self;
    roln_real *x = room((size_t)P, sizeof *x);
    memcpy(x, latent_theta(b->latent), (size_t)P * sizeof *x);
    b->table = block;
    if (!b->newton) b->newton = newton_new(1, &b->table, s->batch);
    w->picks.factor = newton_balance(task, s, x, seed);
    const int steps = newton_run(b->newton, task, s, x, seconds - (cpu_seconds() - t0), seed);
    memcpy(latent_theta(b->latent), x, (size_t)P * sizeof *x);
    baseline_task_free(task), free(x);
    return steps < 0 ? -1 : 0;
}

void baseline_finish(struct baseline *b)
{
    newton_mean(b->newton, latent_theta(b->latent));
    newton_free(b->newton);
    b->newton = NULL;
}

/* ---- as a predictor ---- */

/* RK4 in the model's unit of time. */
static roln_status step(void *self, roln_real *s, const roln_real *tau, double dt)
{
    static const double c[4] = {0, .5, .5, 1}, w[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const struct baseline *b = self;
    struct model *m = b->model;
    const int n = m->kind->n;
    const roln_real t = m->sc->t, h = (roln_real)dt / t;
    roln_real k[2 * LATENT_MOST] = {0}, x[2 * LATENT_MOST], y[2 * LATENT_MOST], tau_z[LATENT_MOST];
    for (int i = 0; i < 2 * n; i++)
        y[i] = s[i] *= i < n ? 1 : t;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 2 * n; i++)
            x[i] = s[i] + (roln_real)c[j] * h * k[i];
        roln_status st = tau ? m->kind->reduce(m->self, x, tau, tau_z) : ROLN_OK;
        for (int i = 0; i < n && tau; i++)
            tau_z[i] *= t * t;
        if (st == ROLN_OK) st = latent_rate(b->latent, x, tau ? tau_z : NULL, k);
        if (st != ROLN_OK) return st;
        for (int i = 0; i < 2 * n; i++)
            y[i] += (roln_real)w[j] * h * k[i];
    }
    for (int i = 0; i < 2 * n; i++)
        s[i] = i < n ? y[i] : y[i] / t;
    return roln_all_finite(2 * n, s) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

static roln_status encode(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    return model_encode(((struct baseline *)self)->model, q, qd, s);
}

static roln_status decode(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    return model_decode(((struct baseline *)self)->model, s, q, qd);
}

static roln_status accelerate(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd)
{
    const struct baseline *b = self;
    const int n = b->model->kind->n;
    roln_real z[3 * LATENT_MOST], rate[2 * LATENT_MOST], tau_z[LATENT_MOST];
    roln_status st = model_latent(b->model, q, qd, NULL, tau, z, tau_z);
    if (st == ROLN_OK) st = latent_rate(b->latent, z, tau ? tau_z : NULL, rate);
    if (st != ROLN_OK) return st;
    memcpy(z + 2 * n, rate + n, (size_t)n * sizeof *z);
    model_lift(b->model, z, qdd);
    return ROLN_OK;
}

struct predictor baseline_predictor(struct baseline *b)
{
    const struct predictor p = {b->model->kind->N, 2 * b->model->kind->n, b, encode, step, decode, accelerate, NULL};
    return p;
}
