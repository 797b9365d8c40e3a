/* SPDX-License-Identifier: MIT */
/* train.c - stages of training of RO-LNN and its relatives: Riemannian Adam, charts in closed form, Gauss-Newton, L-BFGS. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"
#include "sizes.h"

enum { BLOCK = 16 }; /* windows together */

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

struct adam {
    roln_real *work, *g;
    roln_moments moved;
    roln_adam state;
    int refused;
};

static void adam_open(struct adam *a, const struct model *m, int grad_work)
{
    const int update_work = roln_update_work(m->blocks, m->table);
    int moments = 0;
    for (int b = 0; b < m->blocks; b++)
        moments += roln_block_moments(m->table + b);
    memset(a, 0, sizeof *a);
    a->work = room((size_t)ROLN_MAX(grad_work, update_work), sizeof *a->work);
    a->g = room((size_t)m->params, sizeof *a->g), a->moved.m = room((size_t)m->params, sizeof *a->g);
    a->moved.v = room((size_t)moments, sizeof *a->g), a->moved.v_max = room((size_t)moments, sizeof *a->g);
}

static void adam_close(struct adam *a)
{
    free(a->work), free(a->g), free(a->moved.m), free(a->moved.v), free(a->moved.v_max);
}

static roln_loss weights_of(const struct stage *s)
{
    roln_loss w = {.q = (roln_real)s->w_q, .qd = (roln_real)s->w_qd};
    if (s->kind == STAGE_ACC) w.qdd_pred = (roln_real)s->w_acc, w.force = (roln_real)s->w_force;
    if (s->kind == STAGE_ACC && s->lr_ae > 0) w.qdd = w.zdd = w.qdd_pred; /* else the chart is what it is */
    if (s->kind == STAGE_ODE) w.zd = w.qd_pred = w.qd, w.z = w.q_pred = (roln_real)s->w_pos;
    return w;
}

/* One update; rate: factor of the learning rates. Returns the loss of its windows, whose number is added to *seen. */
static double adam_update(struct adam *a, struct model *m, const struct stage *s, const roln_batch *b, double dt, double rate,
                          double *seen)
{
    const roln_trained trainee = model_trained(m);
    const roln_loss w = weights_of(s);
    roln_opt opt = ROLN_OPT((roln_real)(rate * s->lr_ae), (roln_real)(rate * s->lr_net));
    roln_loss loss = {0};
    roln_real windows = 0;
    const roln_gradient to = roln_gradient_of(&m->md, a->g, &loss, &windows);
    opt.lr[2] *= (roln_real)s->bias;
    memset(a->g, 0, (size_t)m->params * sizeof *a->g);
    roln_status st = s->kind == STAGE_ACC ? roln_grad_acc(&trainee, &w, b, BLOCK, &to, a->work)
                                          : roln_grad(&trainee, &w, b, (roln_real)dt, BLOCK, &to, a->work);
    if (st == ROLN_OK) st = roln_adam_update(m->blocks, m->table, &opt, 1 / windows, a->g, m->theta, &a->state, &a->moved, a->work);
    if (st != ROLN_OK) return a->refused++, 0;
    *seen += (double)windows;
    return (double)roln_loss_total(&w, &loss);
}

/* The rate falls with the seconds that are over. */
static int train_adam(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                      double *samples)
{
    const struct sizes sz = sizes_of(&m->md, BLOCK);
    const int H = s->kind == STAGE_ODE ? s->steps : 0, stride = s->kind == STAGE_ODE ? s->stride : 1;
    const double t0 = cpu_seconds();
    double sum = 0, seen = 0, done = 0;
    int count, *start = starts_of(d, s->kind == STAGE_ACC, H * stride, &count), at = count, t = 0, looks = 1;
    struct adam a;
    adam_open(&a, m, s->kind == STAGE_ACC ? ROLN_GRAD_ACC_WORK(SZ, BLOCK) : ROLN_GRAD_WORK(SZ, BLOCK, H));
    while (done < 1) {
        const double rate = (double)roln_schedule((uint32_t)(1e6 * done), 5000, 1000000, (roln_real)s->fall);
        if (at + s->batch > count) roln_shuffle(count, start, &seed), at = 0;
        const roln_batch b = batch_of(d, s->batch, H, stride, start + at);
        at += s->batch, t++;
        sum += adam_update(&a, m, s, &b, d->dt * stride, rate, &seen);
        done = (cpu_seconds() - t0) / seconds;
        if (s->most > 0) done = fmax(done, (double)t / s->most);
        if (10 * done < looks) continue;
        printf("%s %7d  loss %.2e  refused %d\n",
               s->kind == STAGE_ACC ? "acceleration"
               : H                  ? "ode"
                                    : "autoencoder",
               t, sum / seen, a.refused);
        fflush(stdout);
        sum = seen = 0, looks = (int)(10 * done) + 1;
    }
    if (s->kind == STAGE_ODE) m->dt = (roln_real)(d->dt * stride);
    *samples += (double)t * s->batch * (H + 1);
    adam_close(&a), free(start);
    if (a.refused <= t / 20) return 0;
    fprintf(stderr, "adam: %d of %d updates refused\n", a.refused, t);
    return -1;
}

/* ---- Gauss-Newton: rows of the networks behind the autoencoder, which stays ---- */

struct rows {
    struct newton_task task;
    const struct model *m;
    const struct motion *d;
    const struct stage *s;
    struct picks picks;
    roln_real *theta, *work;
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
    const roln_loss acc = {.qdd_pred = 1, .force = (roln_real)w->s->w_force}, pred = {.q_pred = c, .qd_pred = c / 10};
    return window ? pred : acc;
}

/* One by one, so that a window that fails does not end the call. */
static void rows(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r)
{
    struct rows *w = self;
    const struct model *m = w->m;
    const int front = roln_ae_params(&m->md.ae), P = m->params - front;
    roln_trained at = model_trained(m);
    memcpy(w->theta + front, x, (size_t)P * sizeof *x);
    at.theta = w->theta;
    for (int k = 0; k < count; k++) {
        const int window = w->picks.window[from + k];
        const roln_loss weights = row_weights(w, window);
        const roln_batch b = batch_of(w->d, 1, window ? w->s->steps : 0, window ? w->s->stride : 1, w->picks.start + from + k);
        const roln_rows_to to = {J ? J + (size_t)k * (size_t)P : NULL, r + k, 1, w->picks.signs + (uint64_t)(from + k)};
        roln_rows(&at, &weights, &b, (roln_real)(w->d->dt * w->s->stride), &to, w->work);
        *w->samples += window ? w->s->steps + 1 : 1;
    }
}

struct newton_task *model_task(const struct model *m, const struct motion *d, const struct stage *s, double *samples)
{
    const struct sizes sz = sizes_of(&m->md, BLOCK);
    const int work = ROLN_MAX(ROLN_GRAD_ACC_WORK(SZ, BLOCK), ROLN_GRAD_WORK(SZ, BLOCK, s->steps));
    struct rows *w = room(1, sizeof *w);
    w->task.self = w, w->task.draw = draw, w->task.rows = rows;
    w->m = m, w->d = d, w->s = s, w->samples = samples;
    picks_open(&w->picks, d, s);
    w->theta = room((size_t)m->params, sizeof *w->theta), w->work = room((size_t)work, sizeof *w->work);
    memcpy(w->theta, m->theta, (size_t)m->params * sizeof *w->theta);
    return &w->task;
}

void model_task_free(struct newton_task *task)
{
    struct rows *w = task->self;
    picks_close(&w->picks), free(w->theta), free(w->work), free(w);
}

static int train_newton(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                        double *samples)
{
    roln_real *x = m->theta + roln_ae_params(&m->md.ae);
    struct newton_task *task = model_task(m, d, s, samples);
    struct rows *w = task->self;
    if (!m->newton) m->newton = newton_new(m->blocks - m->front, m->table + m->front, s->batch);
    w->picks.factor = newton_balance(task, s, x, seed);
    const int steps = newton_run(m->newton, task, s, x, seconds, seed);
    if (s->share > 0) m->dt = (roln_real)(d->dt * s->stride);
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
    const struct model *m = f->rows->m;
    const roln_loss weights = row_weights(f->rows, 0);
    const int front = roln_ae_params(&m->md.ae);
    roln_trained at = model_trained(m);
    roln_loss loss = {0};
    roln_real windows = 0;
    const roln_gradient to = {.net = g, .loss = &loss, .windows = &windows};
    memcpy(f->rows->theta + front, x, (size_t)(m->params - front) * sizeof *x);
    at.theta = f->rows->theta;
    *f->rows->samples += f->batch.count;
    if (roln_grad_acc(&at, &weights, &f->batch, BLOCK, &to, f->rows->work) != ROLN_OK) return ROLN_C(0.0) / ROLN_C(0.0);
    for (int i = 0; i < m->params - front; i++)
        g[i] /= windows;
    return roln_loss_total(&weights, &loss) / windows;
}

static int train_lbfgs(struct model *m, const struct motion *d, const struct stage *s, double seconds, uint64_t seed,
                       double *samples)
{
    enum { PAIRS = 20 };
    const double t0 = cpu_seconds();
    const int front = roln_ae_params(&m->md.ae), P = m->params - front;
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
        st = roln_lbfgs_step(m->blocks - m->front, m->table + m->front, PAIRS, fixed_value, &f, &state, m->theta + front, keep,
                             work);
        if (t % 100 == 99) printf("l-bfgs %5d  loss %.2e\n", t + 1, (double)state.value), fflush(stdout);
    }
    free(keep), free(work), model_task_free(task);
    return st == ROLN_OK || st == ROLN_E_NO_CONVERGENCE ? 0 : refuse("l-bfgs", (int)st);
}

/* ---- charts: the encoder from some samples, the decoder from all ---- */

/* Until a hundredth is gained in AGAIN steps, or the time is over. */
static roln_status turn(struct model *m, const struct motion *d, const struct stage *s, double seconds)
{
    enum { AGAIN = 20 };
    const struct sizes sz = sizes_of(&m->md, 1);
    const double t0 = cpu_seconds();
    const int all = d->count * d->samples, n = sz.n, bent = sz.bent;
    const roln_trained trained = model_trained(m);
    int *start = room((size_t)s->batch, sizeof *start);
    for (int k = 0; k < s->batch; k++)
        start[k] = (int)((double)k * all / s->batch);
    const roln_batch b = {.count = s->batch, .stride = 1, .start = start, .q = d->q, .qd = d->qd};
    roln_lbfgs state = {0};
    roln_real *psi = room((size_t)(n * bent + bent + ROLN_LBFGS_KEEP(ROLN_TURN_PAIRS, n * bent)), sizeof *psi);
    double *sums = room((size_t)(ROLN_CHART_SUMS(SZ) + ROLN_CHART_TURN_ROOM(SZ)), sizeof *sums);
    const roln_turn t = {&state, psi, psi + n * bent, psi + n * bent + bent, sums, sums + ROLN_CHART_SUMS(SZ)};
    roln_real *work = room((size_t)ROLN_CHART_TURN_WORK(SZ), sizeof *work), top[LATENT_MOST], residual = 1, before = 2;
    roln_status st = ROLN_OK;
    int k;
    for (k = 0; st == ROLN_OK && (s->most == 0 || k < s->most) && cpu_seconds() - t0 < seconds; k++) {
        st = roln_chart_turn(&trained, &b, &t, m->theta, top, &residual, work);
        if (k % AGAIN != AGAIN - 1) continue;
        if (!(residual < ROLN_C(0.99) * before)) break;
        before = residual;
    }
    printf("chart, %d steps: %.5f %%, status %d\n", k, 100 * (double)residual, (int)st);
    free(start), free(psi), free(sums), free(work);
    return st == ROLN_E_NO_CONVERGENCE ? ROLN_OK : st;
}

/* Of a model without a chart nothing. */
static int train_chart(struct model *m, const struct motion *d, const struct stage *s, double seconds, double *samples)
{
    if (m->md.ae.curves == 0) return 0;
    const struct sizes sz = sizes_of(&m->md, 1);
    const roln_ae *ae = &m->md.ae;
    const int all = d->count * d->samples;
    double *sums = room((size_t)ROLN_CHART_SUMS(SZ), sizeof *sums);
    double *more = room((size_t)ROLN_MAX(ROLN_CHART_ADD_ROOM(SZ), ROLN_CHART_SOLVE_ROOM(SZ)), sizeof *more);
    roln_real *work = room((size_t)ROLN_CHART_ADD_WORK(SZ), sizeof *work), residual = 1;
    roln_status st = s->batch > 0 ? turn(m, d, s, seconds) : ROLN_OK;
    if (st == ROLN_OK) st = roln_chart_add(ae, m->theta, all, d->q, 1 / m->sc.q, NULL, sums, more, work);
    if (st == ROLN_OK) st = roln_chart_solve(ae, sums, ROLN_CHART_RIDGE, m->theta, &residual, more);
    printf("chart, all samples: %.5f %%\n", 100 * (double)residual), fflush(stdout);
    *samples += all;
    free(sums), free(more), free(work);
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
    if (m->newton) newton_mean(m->newton, m->theta + roln_ae_params(&m->md.ae));
    newton_free(m->newton);
    m->newton = NULL;
}
