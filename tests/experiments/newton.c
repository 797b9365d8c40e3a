/* SPDX-License-Identifier: MIT */
/* newton.c - recursive Gauss-Newton (roln_riem.h, section 7) as a trainer, with the same constants for every model here. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "experiment.h"

/* Rows of the first step are FIRST times as many. JUDGES rows judge a step, which is tried at most TRIES times. MEMORY: in steps,
   where a stage says nothing else; the mean of as many iterates is the result. */
enum { FIRST = 4, JUDGES = 256, TRIES = 10, MEMORY = 8, IN_VAIN = 20, AWAY = 1000 };

struct newton {
    const roln_block *table;
    int blocks, rows, params, flat; /* flat: Euclidean blocks alone, whose points have a mean */
    roln_newton state;
    uint32_t iterates;                          /* in the mean */
    roln_real *J, *r, *weight, *expect, *there; /* [rows + 1][params], [rows] */
    roln_real *S, *keep, *next, *mean, *ridge, *work;
    int *left_out; /* [rows] */
};

double cpu_seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static roln_real *room(size_t n)
{
    roln_real *p = calloc(n ? n : 1, sizeof *p);
    if (!p) fprintf(stderr, "newton: out of memory\n"), exit(1);
    return p;
}

static int *ints(size_t n)
{
    int *p = calloc(n ? n : 1, sizeof *p);
    if (!p) fprintf(stderr, "newton: out of memory\n"), exit(1);
    return p;
}

struct newton *newton_new(int blocks, const roln_block *table, int rows)
{
    static const roln_newton start = ROLN_NEWTON_START;
    const int P = roln_product_size(blocks, table), side = ROLN_NEWTON_SIDE(rows, P);
    struct newton *n = calloc(1, sizeof *n);
    int verb = 0;
    if (!n) fprintf(stderr, "newton: out of memory\n"), exit(1);
    n->flat = 1;
    for (int b = 0; b < blocks; b++)
        if (table[b].manifold != ROLN_EUCLIDEAN && roln_block_size(table + b) > 0) {
            const int work = table[b].manifold->work(table[b].rows, table[b].cols);
            verb = ROLN_MAX(verb, work), n->flat = 0;
        }
    const int step = ROLN_NEWTON_STEP_WORK(rows, P, verb);
    n->table = table, n->blocks = blocks, n->rows = rows, n->params = P, n->state = start;
    n->J = room((size_t)(rows + 1) * (size_t)P);
    n->r = room(4 * (size_t)rows), n->weight = n->r + rows, n->expect = n->weight + rows, n->there = n->expect + rows;
    n->S = room((size_t)side * (size_t)(side + 1));
    n->keep = room(4 * (size_t)P), n->next = n->keep + P, n->mean = n->next + P, n->ridge = n->mean + P;
    n->work = room((size_t)ROLN_MAX(step, ROLN_SYM_WORK));
    n->left_out = ints((size_t)rows);
    return n;
}

void newton_free(struct newton *n)
{
    if (!n) return;
    free(n->J), free(n->r), free(n->S), free(n->keep), free(n->work), free(n->left_out), free(n);
}

/* Fresh rows at x, added to the sums with the memory that opt gives. One that ran away, AWAY times as far as the usual one of the
   step before, is left out. */
static int gather(struct newton *n, const struct newton_task *task, double share, const roln_newton_opt *opt, const roln_real *x,
                  uint64_t *seed)
{
    const size_t P = (size_t)n->params;
    const roln_real usual = n->state.taken > 0 ? n->state.loss / (roln_real)n->rows : ROLN_C(1e24);
    const roln_real most = ROLN_MIN(AWAY * AWAY * usual, ROLN_C(1e30));
    task->draw(task->self, n->rows, share, seed);
    task->rows(task->self, x, 0, n->rows, n->J, n->r);
    for (int k = 0; k < n->rows; k++) {
        const roln_real *row = n->J + (size_t)k * P;
        n->left_out[k] = !(n->r[k] * n->r[k] < most && roln_dot(n->params, row, row) < ROLN_C(1e30));
        if (!n->left_out[k]) continue;
        memset(n->J + (size_t)k * P, 0, P * sizeof *n->J);
        n->r[k] = 0;
    }
    if (roln_newton_rows(n->blocks, n->table, opt, n->rows, x, n->J, n->r, n->weight, &n->state, n->work) != ROLN_OK) return -1;
    for (int i = 0; i < n->params && task->ridge; i++)
        n->ridge[i] = n->state.loss * task->ridge[i];
    roln_newton_normal_equations(opt, n->rows, n->params, 0, n->params, n->J, n->S, n->work);
    return 0;
}

/* The first step gets more rows: what the earlier ones ask for is carried along. */
static int gather_first(struct newton *n, const struct newton_task *task, double share, roln_real cap, const roln_real *x,
                        uint64_t *seed)
{
    const roln_newton_opt all = {ROLN_C(1e6), 1, cap, NULL};
    const int P = n->params;
    for (int i = 1; i < FIRST && ROLN_NEWTON_SIDE(n->rows, P) == P; i++) {
        if (gather(n, task, share, &all, x, seed) != 0) return -1;
        rolni_newton_back(n->rows, P, n->J, n->r, n->J + (size_t)n->rows * (size_t)P, n->next);
    }
    return 0;
}

/* Nonzero if a step from x was taken. */
static int step(struct newton *n, const struct newton_task *task, const roln_newton_opt *opt, roln_real *x)
{
    const int P = n->params, judges = ROLN_MIN(JUDGES, n->rows);
    const roln_newton_system system = {n->rows, P, n->J, n->r, n->S};
    const roln_real damping = n->state.lambda;
    roln_real *carried = n->J + (size_t)n->rows * (size_t)P;
    for (int tries = 0; tries < TRIES; tries++) {
        if (roln_newton_step(n->blocks, n->table, opt, &system, x, &n->state, n->next, n->expect, n->keep, n->work) != ROLN_OK)
            return 0;
        task->rows(task->self, n->next, 0, judges, NULL, n->there);
        for (int k = 0; k < judges; k++)
            if (n->left_out[k]) n->there[k] = n->expect[k];
        if (roln_newton_accept(judges, n->r, n->weight, n->expect, n->there, &n->state)) {
            memcpy(x, n->next, (size_t)P * sizeof *x);
            memcpy(carried, n->keep, (size_t)P * sizeof *x);
            return 1;
        }
        if (ROLN_NEWTON_SIDE(n->rows, P) < P) memset(carried, 0, (size_t)P * sizeof *x);
    }
    roln_newton_give_up(damping, &n->state);
    return 0;
}

/* Of few steps, which still lead somewhere, the mean is short. */
static void add_to_mean(struct newton *n, const roln_real *x)
{
    n->iterates = ROLN_MIN(MEMORY, 1 + n->state.taken / 16);
    for (int i = 0; i < n->params; i++)
        n->mean[i] += (x[i] - n->mean[i]) / (roln_real)n->iterates;
}

int newton_run(struct newton *n, const struct newton_task *task, const struct stage *s, roln_real *x, double seconds, uint64_t seed)
{
    roln_newton_opt opt = ROLN_NEWTON_OPT;
    const double t0 = cpu_seconds();
    const double memory = s->memory > 0 ? s->memory : MEMORY, last = s->last > 0 ? s->last : memory;
    int steps = 0, in_vain = 0, looks = 1, more = 1;
    if (task->ridge) opt.ridge = n->ridge;
    if (s->cap > 0) opt.cap = (roln_real)s->cap;
    if (n->state.taken == 0 && gather_first(n, task, s->share, opt.cap, x, &seed) != 0) return -1;
    for (; more && (s->most == 0 || steps < s->most) && cpu_seconds() - t0 < seconds; steps++) {
        const double done = s->most > 0 ? (double)steps / s->most : (cpu_seconds() - t0) / seconds;
        opt.memory = (roln_real)(memory * pow(last / memory, done));
        if (gather(n, task, s->share, &opt, x, &seed) != 0) return fprintf(stderr, "newton: no rows\n"), -1;
        if (step(n, task, &opt, x)) in_vain = 0, add_to_mean(n, x);
        else more = ++in_vain < IN_VAIN;
        if (!more && n->state.taken == 0) return fprintf(stderr, "newton: no step is taken\n"), -1;
        if (more && cpu_seconds() - t0 < looks * seconds / 10 && (s->most == 0 || steps + 1 < s->most)) continue;
        printf("gauss-newton %5d of %4u taken, %u refused  rms %.2e  error %.2f  lambda %.1e\n", steps + 1, n->state.taken,
               n->state.refused, sqrt((double)n->state.loss / n->rows), (double)n->state.error, (double)n->state.lambda);
        fflush(stdout);
        while (looks * seconds / 10 <= cpu_seconds() - t0)
            looks++;
    }
    return steps;
}

void newton_mean(const struct newton *n, roln_real *x)
{
    if (n->flat && n->iterates > 0) memcpy(x, n->mean, (size_t)n->params * sizeof *x);
}

/* ---- which samples ---- */

void picks_open(struct picks *p, const struct motion *d, const struct stage *s)
{
    const int all = d->count * d->samples, reach = s->steps * s->stride;
    memset(p, 0, sizeof *p);
    p->factor = 1;
    p->single = ints((size_t)all), p->longer = ints((size_t)all);
    p->start = ints((size_t)s->batch), p->window = ints((size_t)s->batch);
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i < d->samples; i++) {
            if (i > 0 && i + 1 < d->samples) p->single[p->singles++] = k * d->samples + i;
            if (i + reach < d->samples) p->longer[p->windows++] = k * d->samples + i;
        }
}

void picks_close(struct picks *p)
{
    free(p->single), free(p->longer), free(p->start), free(p->window);
}

void picks_draw(struct picks *p, int count, double share, uint64_t *seed)
{
    p->signs = roln_rand(seed);
    for (int k = 0; k < count; k++) {
        p->window[k] = (double)roln_uniform(seed) < share;
        p->start[k] = p->window[k] ? p->longer[roln_randint(p->windows, seed)] : p->single[roln_randint(p->singles, seed)];
    }
}

static int by_size(const void *a, const void *b)
{
    const roln_real x = *(const roln_real *)a, y = *(const roln_real *)b;
    return (x > y) - (x < y);
}

double newton_balance(const struct newton_task *task, const struct stage *s, const roln_real *x, uint64_t seed)
{
    enum { SOME = 101, WINDOW = 3 };
    roln_real middle[2], r[SOME];
    const int some = ROLN_MIN(SOME, s->batch);
    if (s->share <= 0 || s->share >= 1) return 1;
    for (int windows = 0; windows < 2; windows++) {
        task->draw(task->self, some, windows, &seed);
        task->rows(task->self, x, 0, some, NULL, r);
        for (int k = 0; k < some; k++)
            r[k] = roln_finite(r[k]) ? ROLN_ABS(r[k]) : ROLN_C(1e30);
        qsort(r, (size_t)some, sizeof *r, by_size);
        middle[windows] = r[some / 2];
    }
    return middle[1] > 0 && middle[1] < ROLN_C(1e30) ? (double)(WINDOW * middle[0] / middle[1]) : 1;
}
