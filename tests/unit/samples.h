/* SPDX-License-Identifier: MIT */
/* samples.h - what the tests of training share: random data in windows of every kind of loss, losses as numbers, gradients of an
   instance from nothing. Include after small.h; CALLED has grad and grad_acc. */
#ifndef SAMPLES_H
#define SAMPLES_H

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* Kinds of data: the ODE loss, the acceleration loss, the variational loss. The first of each has windows that follow each other
   and forces; the second a stride of 2 and given starts, and no forces but in the acceleration loss. */
enum { ODE, ODE_FREE, ACC, ACC_STARTS, VAR, VAR_FREE, KINDS };
ROLN_FN int is_acc(int kind)
{
    return kind == ACC || kind == ACC_STARTS;
}
ROLN_FN int is_var(int kind)
{
    return kind == VAR || kind == VAR_FREE;
}

/* A loss, or weights of one, as numbers too. */
enum { Q, QD, QDD, Z, ZD, ZDD, Q_PRED, QD_PRED, QDD_PRED, FORCE, TERMS };
typedef union {
    roln_loss loss;
    roln_real term[TERMS];
} terms;

/* The terms that ODE, acceleration and variational loss have. */
static const int has_term[3][TERMS] = {
    {1, 1, 0, 1, 1, 0, 1, 1, 0, 0},
    {1, 1, 1, 0, 0, 1, 0, 0, 1, 1},
    {1, 0, 0, 1, 0, 0, 1, 0, 0, 0},
};

static const terms weights = {{.q = ROLN_C(1.0),
                               .qd = ROLN_C(0.5),
                               .qdd = ROLN_C(0.75),
                               .z = ROLN_C(0.625),
                               .zd = ROLN_C(0.875),
                               .zdd = ROLN_C(0.375),
                               .q_pred = ROLN_C(0.25),
                               .qd_pred = ROLN_C(1.0625),
                               .qdd_pred = ROLN_C(0.4375),
                               .force = ROLN_C(0.6875)}};

enum { MAXD = 4000, WINDOWS = 16 };
typedef struct {
    roln_real q[MAXD], qd[MAXD], qdd[MAXD], tau[MAXD], h;
    int start[WINDOWS];
    roln_batch b;
} data;

/* The model that only a soft motion suits. */
#if defined OF_ACTUATORS || defined OF_DRIVEN
enum { SOFT = 1 };
#else
enum { SOFT = PUSHED };
#endif

/* `count` windows of a kind for model k. */
ROLN_FN void make(int k, int kind, int count, uint64_t *s, data *d)
{
    const int N = N_OF(k), H = is_acc(kind) ? 0 : models[k]->horizon, stride = kind % 2 + 1, length = H * stride + 1;
    const int soft = is_var(kind) || k == SOFT; /* a motion that midpoint can follow */
    const int numbers = (count * length + stride) * N;
    int i;
    CHECK(numbers <= MAXD && count <= WINDOWS);
    dyadic(numbers, 2, s, d->q), dyadic(numbers, soft ? 1 : 2, s, d->qd);
    dyadic(numbers, 4, s, d->qdd), dyadic(numbers, soft ? 1 : 4, s, d->tau);
    for (i = N; i < numbers && is_var(kind); i++)
        d->q[i] = d->q[i % N] + d->q[i] / 64;
    for (i = 0; i < count; i++)
        d->start[i] = (count - 1 - i) * length;
    d->h = soft ? dt / 8 : dt;
    d->b.count = count, d->b.steps = H, d->b.stride = stride;
    d->b.start = kind % 2 ? d->start : NULL;
    d->b.q = d->q;
    d->b.qd = is_var(kind) ? NULL : d->qd;
    d->b.qdd = is_acc(kind) ? d->qdd : NULL;
    d->b.tau = kind % 2 && !is_acc(kind) ? NULL : d->tau;
}

/* First sample of window w. */
ROLN_FN int first_of(const roln_batch *b, int w)
{
    return b->start ? b->start[w] : w * (b->steps * b->stride + 1);
}

/* The mean force of the step that begins at a sample; 0 without forces. */
ROLN_FN void mean_force(const roln_batch *b, int size, int sample, roln_real *tau)
{
    int i, j;
    for (i = 0; i < size; i++) {
        ld sum = 0;
        for (j = 0; j < b->stride && b->tau; j++)
            sum += (ld)b->tau[(sample + j) * size + i] / b->stride;
        tau[i] = (roln_real)sum;
    }
}

/* What NAME_gradient sums. */
typedef struct {
    roln_real theta[MAXP];
    terms t;
    roln_real windows;
} gradient;

/* Adds gradient, loss and windows of d->b, of the acceleration loss if there are accelerations. Plainly: what was added before is
   the rest of a sum of 0, to which NAME_grad goes on adding. */
ROLN_FN roln_status add_grad(const instance *m, const roln_loss *wt, const data *d, gradient *to)
{
    static roln_real g[GRADIENT_SIZE(MAXP)];
    const int P = m->of->params, acc = d->b.qdd != NULL;
    roln_real *rest = g + P + GRADIENT_REST, *work = room_of(acc ? m->of->scratch.grad_acc : m->of->scratch.grad);
    roln_status st;
    memset(g, 0, sizeof g);
    memcpy(rest, to->theta, (size_t)P * sizeof *g), memcpy(rest + P, to->t.term, sizeof to->t), rest[P + TERMS] = to->windows;
    st = acc ? m->of->grad_acc(m, wt, &d->b, g, work) : m->of->grad(m, wt, &d->b, d->h, g, work);
    ROOM_KEPT();
    if (!all(1, g + P + TERMS, 0)) rest = g; /* a block at least was added */
    memcpy(to->theta, rest, (size_t)P * sizeof *g), memcpy(to->t.term, rest + P, sizeof to->t), to->windows = rest[P + TERMS];
    return st;
}

/* The same from nothing. */
ROLN_FN roln_status grad_of(const instance *m, const data *d, gradient *to)
{
    roln_status st;
    memset(to, 0, sizeof *to);
    st = add_grad(m, &weights.loss, d, to);
    CHECK(st != ROLN_OK || all(1, &to->windows, (roln_real)d->b.count));
    return st;
}

/* The count windows of d from window w on. */
ROLN_FN void some_windows(const data *d, int w, int count, data *to)
{
    int i;
    to->b = d->b, to->h = d->h;
    to->b.count = count, to->b.start = to->start;
    for (i = 0; i < count; i++)
        to->start[i] = first_of(&d->b, w + i);
}

ROLN_FN double weighted(const terms *t)
{
    double s = 0;
    int i;
    for (i = 0; i < TERMS; i++)
        s += (double)weights.term[i] * (double)t->term[i];
    return s;
}

/* |x - y|^2 */
ROLN_FN ld apart(int n, const roln_real *x, const roln_real *y)
{
    ld sum = 0;
    int i;
    for (i = 0; i < n; i++)
        sum += ((ld)x[i] - (ld)y[i]) * ((ld)x[i] - (ld)y[i]);
    return sum;
}

/* x - y of number i of positions, of an angle by the shorter way. */
ROLN_FN ld difference(int k, int i, ld x, ld y)
{
    return models[k]->md->lnn.angles >> i & 1 ? remainderl(x - y, 8 * atanl(1)) : x - y;
}

#endif
