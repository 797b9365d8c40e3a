/* SPDX-License-Identifier: MIT */
/* train.c - stages of training of RO-LNN and its relatives: Riemannian Adam, charts in closed form, Gauss-Newton, L-BFGS. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

static void *room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (!p) fprintf(stderr, "train: out of memory\n"), exit(1);
    return p;
}

static int refuse(const char *stage, int status)
{
    fprintf(stderr, "%s: status %d\n", stage, status);
    return -1;
}

/* Samples that may begin a window of `reach` samples; with central differences of their own, none of which the ends have. */
static int *starts_of(const struct motion *d, int central, int reach, int *count)
{
    int *start = room((size_t)(d->count * d->samples), sizeof *start);
    *count = 0;
    for (int k = 0; k < d->count; k++)
        for (int i = central; i + (central ? 1 : reach) < d->samples; i++)
            start[(*count)++] = k * d->samples + i;
    return start;
}

static roln_batch batch_of(const struct motion *d, int count, int steps, int stride, const int *start)
{
    const int acc = steps == 0;
    const roln_batch b = {.count = count,
                          .steps = steps,
                          .stride = stride,
                          .start = start,
                          .q = d->q,
                          .qd = d->qd,
                          .qdd = acc ? d->qdd : NULL,
                          .tau = acc ? d->tau_mid : d->tau};
    return b;
}

/* ---- Riemannian Adam ---- */

static roln_loss weights_of(const struct stage *s)
{
    roln_loss w = {.q = (roln_real)s->w_q, .qd = (roln_real)s->w_qd};
    if (s->kind == STAGE_ACC) w.qdd_pred = (roln_real)s->w_acc, w.force = (roln_real)s->w_force;
    if (s->kind == STAGE_ACC && s->lr_ae > 0) w.qdd = w.zdd = w.qdd_pred; /* else the chart is what it is */
    if (s->kind == STAGE_ODE) w.zd = w.qd_pred = w.qd, w.z = w.q_pred = (roln_real)s->w_pos;
    return w;
}

/* The rate falls with the seconds that are over. */
static int train_adam(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                      double *samples)
{
    const int H = s->kind == STAGE_ODE ? s->steps : 0, stride = s->kind == STAGE_ODE ? s->stride : 1;
    const roln_loss weights = weights_of(s);
    const double t0 = cpu_seconds();
    double sum = 0, seen = 0, done = 0;
    int count, *start = starts_of(d, s->kind == STAGE_ACC, H * stride, &count), at = count, t = 0, looks = 1, refused = 0;
    m->kind->forget(m->self);
    while (done < 1) {
        const double rate = (double)roln_schedule((uint32_t)(1e6 * done), 5000, 1000000, (roln_real)s->fall);
        roln_opt opt = ROLN_OPT((roln_real)(rate * s->lr_ae), (roln_real)(rate * s->lr_net));
        opt.lr[2] *= (roln_real)s->bias;
        if (at + s->batch > count) roln_shuffle(count, start, &seed), at = 0;
        roln_batch b = batch_of(d, s->batch, H, stride, start + at);
        if (s->kind != STAGE_ACC) b.qdd = NULL;
        at += s->batch, t++;
        refused += m->kind->adam(m->self, &weights, &b, d->dt * stride, &opt, &sum, &seen) != ROLN_OK;
        done = (cpu_seconds() - t0) / seconds;
        if (s->most > 0) done = fmax(done, (double)t / s->most);
        if (10 * done < looks) continue;
        printf("%s %7d  loss %.2e  refused %d\n",
               s->kind == STAGE_ACC ? "acceleration"
               : H                  ? "ode"
                                    : "autoencoder",
               t, sum / seen, refused);
        fflush(stdout);
        sum = seen = 0, looks = (int)(10 * done) + 1;
    }
    if (s->kind == STAGE_ODE) *m->dt = (roln_real)(d->dt * stride);
    *samples += (double)t * s->batch * (H + 1);
    free(start);
    if (refused <= t / 20) return 0;
    fprintf(stderr, "adam: %d of %d updates refused\n", refused, t);
    return -1;
}

/* ---- Gauss-Newton: rows of the networks behind the autoencoder, which stays ---- */

struct rows {
    struct newton_task task;
    struct model m; /* a copy, with networks of its own */
    const struct motion *d;
    const struct stage *s;
    struct picks picks;
    roln_real forces; /* weight of forces in rows of samples */
    double *samples;
};

static void draw(void *self, int count, double share, uint64_t *seed)
{
    struct rows *w = self;
    picks_draw(&w->picks, count, share, seed);
}

static roln_loss row_weights(const struct rows *w, int window)
{
    const roln_real c = (roln_real)(w->picks.factor * w->picks.factor);
    const roln_loss acc = {.qdd_pred = 1, .force = w->forces}, pred = {.q_pred = c, .qd_pred = c / 10};
    return window ? pred : acc;
}

/* The networks of the model: x. */
static void put(struct model *m, const roln_real *x)
{
    memcpy(m->theta + m->kind->front, x, (size_t)(m->kind->params - m->kind->front) * sizeof *x);
}

/* One by one, so that a window that fails does not end the call. Polynomials have a ridge, which would make M and V ever smaller
   where no force tells their scale: the last row of a step holds it. */
static void rows(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r)
{
    struct rows *w = self;
    const size_t P = (size_t)(w->m.kind->params - w->m.kind->front);
    put(&w->m, x);
    for (int k = 0; k < count; k++) {
        roln_real *const row = J ? J + (size_t)k * P : NULL;
        const int window = w->picks.window[from + k];
        if (w->m.kind->hold && !w->d->tau && from + k + 1 == w->s->batch) {
            w->m.kind->hold(w->m.self, row, r + k);
            continue;
        }
        const roln_loss weights = row_weights(w, window);
        const roln_batch b = batch_of(w->d, 1, window ? w->s->steps : 0, window ? w->s->stride : 1, w->picks.start + from + k);
        w->m.kind->row(w->m.self, &weights, &b, w->d->dt * w->s->stride, w->picks.signs + (uint64_t)(from + k),
                       row, r + k);
        *w->samples += window ? w->s->steps + 1 : 1;
    }
}

/* Of the loss that forces have in rows; none without a stage that asks for them. */
static void weigh_forces(struct rows *w, uint64_t seed)
{
    enum { SOME = 2000 };
    const int some = ROLN_MIN(SOME, w->s->batch);
    if (w->s->w_force <= 0) return;
    draw(w, some, 0, &seed);
    const roln_batch b = batch_of(w->d, some, 0, 1, w->picks.start);
    w->forces = (roln_real)w->s->w_force * w->m.kind->weigh(w->m.self, &b);
}

struct newton_task *model_task(const struct model *m, const struct motion *d, const struct stage *s, double *samples)
{
    struct rows *w = room(1, sizeof *w);
    w->task.self = w, w->task.draw = draw, w->task.rows = rows;
    w->d = d, w->s = s, w->samples = samples;
    picks_open(&w->picks, d, s);
    model_copy(&w->m, m);
    weigh_forces(w, 1);
    const struct config *kind = m->kind;
    if (kind->ridge && kind->range(w->m.self, d->count * d->samples, d->q, d->qd) == ROLN_OK) {
        w->task.ridge = room((size_t)(kind->params - kind->front), sizeof *w->task.ridge);
        kind->ridge(w->m.self, w->task.ridge);
    }
    return &w->task;
}

void model_task_free(struct newton_task *task)
{
    struct rows *w = task->self;
    picks_close(&w->picks), model_free(&w->m), free(w->task.ridge), free(w);
}

static int train_newton(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                        double *samples)
{
    const struct config *kind = m->kind;
    const int front = model_front(kind);
    roln_real *x = m->theta + kind->front;
    struct newton_task *task = model_task(m, d, s, samples);
    struct rows *w = task->self;
    if (!m->newton) m->newton = newton_new(kind->blocks - front, kind->table + front, s->batch);
    w->picks.factor = newton_balance(task, s, x, seed);
    const int steps = newton_run(m->newton, task, s, x, seconds, seed);
    if (s->share > 0) *m->dt = (roln_real)(d->dt * s->stride);
    model_task_free(task);
    return steps < 0 ? -1 : 0;
}

/* ---- L-BFGS of the networks, accelerations of samples that stay ---- */

struct fixed {
    struct rows *rows;
    roln_batch batch;
};

static roln_real fixed_value(void *self, const roln_real *x, roln_real *g)
{
    struct fixed *f = self;
    struct model *m = &f->rows->m;
    const roln_loss weights = row_weights(f->rows, 0);
    put(m, x);
    *f->rows->samples += f->batch.count;
    return m->kind->loss(m->self, &weights, &f->batch, g);
}

static int train_lbfgs(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                       double *samples)
{
    enum { PAIRS = 20 };
    const double t0 = cpu_seconds();
    const struct config *kind = m->kind;
    const int front = model_front(kind), P = kind->params - kind->front;
    roln_lbfgs state = ROLN_LBFGS_START;
    roln_status st = ROLN_OK;
    struct fixed f;
    struct newton_task *task = model_task(m, d, s, samples);
    f.rows = task->self;
    draw(f.rows, s->batch, 0, &seed);
    f.batch = batch_of(d, s->batch, 0, 1, f.rows->picks.start);
    roln_real *keep = room((size_t)ROLN_LBFGS_KEEP(PAIRS, P), sizeof *keep);
    roln_real *work = room((size_t)ROLN_LBFGS_WORK(PAIRS, P, 0), sizeof *work);
    for (int t = 0; st == ROLN_OK && (s->most == 0 || t < s->most) && cpu_seconds() - t0 < seconds; t++) {
        st = roln_lbfgs_step(kind->blocks - front, kind->table + front, PAIRS, fixed_value, &f, &state, m->theta + kind->front,
                             keep, work);
        if (t % 100 == 99) printf("l-bfgs %5d  loss %.2e\n", t + 1, (double)state.value), fflush(stdout);
    }
    free(keep), free(work), model_task_free(task);
    return st == ROLN_OK || st == ROLN_E_NO_CONVERGENCE ? 0 : refuse("l-bfgs", (int)st);
}

/* ---- charts: the encoder from some samples, the decoder from all ---- */

/* Steps of the encoder: until less than a hundredth is gained in AGAIN of them, or the time is over. */
struct turning {
    const struct stage *s;
    double t0, seconds, before;
    int steps;
};

static int more(void *ctx, int steps, double left)
{
    enum { AGAIN = 20 };
    struct turning *t = ctx;
    t->steps = steps;
    if (steps > 0 && steps % AGAIN == 0) {
        if (!(left < .99 * t->before)) return 0;
        t->before = left;
    }
    return (t->s->most == 0 || steps < t->s->most) && cpu_seconds() - t->t0 < t->seconds;
}

/* Of a model without a chart nothing. */
static int train_chart(struct model *m, const struct motion *d, const struct stage *s, double seconds, double *samples)
{
    if (!m->kind->chart) return 0;
    const int all = d->count * d->samples;
    struct turning t = {s, cpu_seconds(), seconds, 2, 0};
    int *start = room((size_t)s->batch, sizeof *start);
    double left;
    for (int k = 0; k < s->batch; k++)
        start[k] = (int)((double)k * all / s->batch);
    const roln_batch b = {.count = s->batch, .stride = 1, .start = start, .q = d->q, .qd = d->qd};
    const roln_status st = m->kind->chart(m->self, s->batch > 0 ? &b : NULL, more, &t, all, d->q, &left);
    printf("chart, %d steps, all samples: %.5f %%, status %d\n", t.steps, 100 * left, (int)st), fflush(stdout);
    *samples += all;
    free(start);
    return st == ROLN_OK ? 0 : refuse("chart", (int)st);
}

/* ---- all of them ---- */

int model_train(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed, double *samples)
{
    switch (s->kind) {
    case STAGE_CHART: return train_chart(m, d, s, seconds, samples);
    case STAGE_NEWTON: return train_newton(m, d, s, seconds, seed, samples);
    case STAGE_LBFGS: return train_lbfgs(m, d, s, seconds, seed, samples);
    default: return train_adam(m, d, s, seconds, seed, samples);
    }
}

void model_finish(struct model *m)
{
    if (m->newton) newton_mean(m->newton, m->theta + m->kind->front);
    newton_free(m->newton);
    m->newton = NULL;
}
