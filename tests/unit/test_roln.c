/* SPDX-License-Identifier: MIT */
/* The whole model (roln.h): loss and gradient against a slow loss and central differences, units, roll-outs and their errors,
   packed and written parameters, failures, sizes of scratch, training. */
#include "small.h"
#include <stdlib.h>

void TEST_NAME(roln)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* ---- data and losses -------------------------------------------------------------------------- */

/* Kinds of data: the ODE loss, the acceleration loss, the variational loss. The first of each has windows that follow each other
   and forces; the second a stride of 2 and given starts, and no forces but in the acceleration loss. */
enum { ODE, ODE_FREE, ACC, ACC_STARTS, VAR, VAR_FREE, KINDS };
static int is_acc(int kind)
{
    return kind == ACC || kind == ACC_STARTS;
}
static int is_var(int kind)
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
static const roln_loss ode_weights = ROLN_ODE_WEIGHTS, acc_weights = ROLN_ACC_WEIGHTS;

enum { MAXD = 4000, WINDOWS = 16 };
typedef struct {
    roln_real q[MAXD], qd[MAXD], qdd[MAXD], tau[MAXD], h;
    int start[WINDOWS];
    roln_batch b;
} data;

/* `count` windows of a kind for model k. */
static void make(int k, int kind, int count, uint64_t *s, data *d)
{
    const int N = N_OF(k), H = is_acc(kind) ? 0 : models[k].horizon, stride = kind % 2 + 1, length = H * stride + 1;
    const int soft = is_var(kind) || k == PUSHED; /* a motion that midpoint can follow */
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
static int first_of(const roln_batch *b, int w)
{
    return b->start ? b->start[w] : w * (b->steps * b->stride + 1);
}

/* The mean force of the step that begins at a sample; 0 without forces. */
static void mean_force(const roln_batch *b, int size, int sample, roln_real *tau)
{
    int i, j;
    for (i = 0; i < size; i++) {
        ld sum = 0;
        for (j = 0; j < b->stride && b->tau; j++)
            sum += (ld)b->tau[(sample + j) * size + i] / b->stride;
        tau[i] = (roln_real)sum;
    }
}

/* Adds gradient, loss and windows of d.b, in blocks of nb windows; the acceleration loss if there are accelerations. */
static roln_status add_grad(int k, const roln_trained *m, const roln_loss *wt, const data *d, int nb, const roln_gradient *to)
{
    const int acc = d->b.qdd != NULL;
    roln_real *work = room_of(acc ? grad_acc_work(k, nb) : grad_work(k, nb, d->b.steps > 0 ? d->b.steps : 0));
    const roln_status st = acc ? roln_grad_acc(m, wt, &d->b, nb, to, work) : roln_grad(m, wt, &d->b, d->h, nb, to, work);
    ROOM_KEPT();
    return st;
}

/* The gradient g [params] and the loss, from nothing. */
static roln_status grad_of(int k, const roln_trained *m, const data *d, int nb, roln_real *g, terms *t)
{
    roln_real windows = 0;
    const roln_gradient to = roln_gradient_of(m->model, g, &t->loss, &windows);
    roln_status st;
    fill(models[k].params, 0, g), fill(TERMS, 0, t->term);
    st = add_grad(k, m, &weights.loss, d, nb, &to);
    CHECK(st != ROLN_OK || all(1, &windows, (roln_real)d->b.count));
    return st;
}

static double weighted(const terms *t)
{
    double s = 0;
    int i;
    for (i = 0; i < TERMS; i++)
        s += (double)weights.term[i] * (double)t->term[i];
    return s;
}

/* The double gradient and loss, for the float test. */
void test_roln_reference(int k, int kind, double *g, double *loss);
#ifdef ROLN_DOUBLE
void test_roln_reference(int k, int kind, double *g, double *loss)
{
    static data d;
    static roln_real theta[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    uint64_t s = (uint64_t)(10 * k + kind);
    terms t;
    parameters(k, &s, theta);
    make(k, kind, 3, &s, &d);
    CHECK_OK(grad_of(k, &m, &d, 16, g, &t));
    memcpy(loss, t.term, sizeof t.term);
}
#endif

/* ---- slow losses ------------------------------------------------------------------------------ */

/* |x - y|^2 */
static ld apart(int n, const roln_real *x, const roln_real *y)
{
    ld sum = 0;
    int i;
    for (i = 0; i < n; i++)
        sum += ((ld)x[i] - (ld)y[i]) * ((ld)x[i] - (ld)y[i]);
    return sum;
}

/* x - y of number i of positions, of an angle by the shorter way. */
static ld difference(int k, int i, ld x, ld y)
{
    return models[k].md->lnn.angles >> i & 1 ? remainderl(x - y, 8 * atanl(1)) : x - y;
}

/* The same of positions. */
static ld away(int k, int n, const roln_real *x, const roln_real *y)
{
    ld sum = 0;
    int i;
    for (i = 0; i < n; i++)
        sum += difference(k, i, (ld)x[i], (ld)y[i]) * difference(k, i, (ld)x[i], (ld)y[i]);
    return sum;
}

/* The ODE loss, sample by sample with the functions of prediction. */
static void slow_loss(int k, const roln_trained *m, const data *d, ld *t)
{
    const roln_batch *b = &d->b;
    const int N = N_OF(k), n = n_OF(k), H = b->steps;
    const ld time2 = (ld)m->scale->t * (ld)m->scale->t, q2 = 1 / ((ld)m->scale->q * (ld)m->scale->q);
    roln_real z[MAXN], zd[MAXN], z_pred[MAXN], zd_pred[MAXN], q[MAXN], qd[MAXN], tau[MAXN];
    int w, h;
    for (w = 0; w < b->count; w++)
        for (h = 0; h <= H; h++) {
            const int sample = first_of(b, w) + h * b->stride;
            const roln_real *q_data = b->q + sample * N, *qd_data = b->qd + sample * N;
            CHECK_OK(roln_encode(m, q_data, qd_data, NULL, z, zd, NULL, ROOM(encode)));
            CHECK_OK(roln_decode(m, z, zd, q, qd, ROOM(decode)));
            t[Q] += away(k, N, q, q_data) * q2 / (H + 1);
            t[QD] += apart(N, qd, qd_data) * q2 * time2 / (H + 1);
            if (h == 0) {
                memcpy(z_pred, z, sizeof z), memcpy(zd_pred, zd, sizeof zd);
                continue;
            }
            mean_force(b, F_OF(k), sample - b->stride, tau);
            CHECK_OK(roln_step(m, z_pred, zd_pred, b->tau ? tau : NULL, d->h, ROOM(step)));
            ROOM_KEPT();
            CHECK_OK(roln_decode(m, z_pred, zd_pred, q, qd, ROOM(decode)));
            t[Z] += away(k, n, z_pred, z) / H;
            t[ZD] += apart(n, zd_pred, zd) * time2 / H;
            t[Q_PRED] += away(k, N, q, q_data) * q2 / H;
            t[QD_PRED] += apart(N, qd, qd_data) * q2 * time2 / H;
        }
}

#ifdef ROLN_DOUBLE
static const double shift[4] = {2e-4, -2e-4, 4e-4, -4e-4};
/* Derivative of what v holds at the four shifts. */
static double slope(double v[4][MAXN], int i)
{
    return (8 * (v[0][i] - v[1][i]) - (v[2][i] - v[3][i])) / (12 * shift[0]);
}

/* x + v t + a t^2 / 2 and v + a t */
static void along(int n, const double *x, const double *v, const double *a, double t, double *xt, double *vt)
{
    int i;
    for (i = 0; i < n; i++) {
        xt[i] = x[i] + t * v[i] + t * t / 2 * a[i];
        vt[i] = v[i] + t * a[i];
    }
}

/* qdd of the decoder along the parabola of z, zd, zdd. */
static void slow_decode(int k, const roln_trained *m, const double *z, const double *zd, const double *zdd, double *qdd)
{
    double v[4][MAXN], zt[MAXN], zdt[MAXN], q[MAXN];
    int i, j;
    for (j = 0; j < 4; j++) {
        along(n_OF(k), z, zd, zdd, shift[j], zt, zdt);
        CHECK_OK(roln_decode(m, zt, zdt, q, v[j], ROOM(decode)));
    }
    for (i = 0; i < N_OF(k); i++)
        qdd[i] = slope(v, i);
}

/* The acceleration loss: second time derivatives of encoder and decoder by Richardson differences along a parabola. */
static void slow_loss_acc(int k, const roln_trained *m, const roln_batch *b, ld *t)
{
    const int N = N_OF(k), n = n_OF(k);
    const ld time2 = (ld)m->scale->t * (ld)m->scale->t, q2 = 1 / ((ld)m->scale->q * (ld)m->scale->q);
    double v[4][MAXN], z[MAXN], zd[MAXN], zdd[MAXN], zdd_pred[MAXN], q[MAXN], qd[MAXN], qdd[MAXN], tau[MAXN], tau_z[MAXN];
    double M[64], c[MAXN], g[MAXN], d[MAXN];
    const roln_terms_out out = {M, c, g, d, NULL, NULL};
    int w, i, j;
    for (w = 0; w < b->count; w++) {
        const int first = first_of(b, w), at = first * N;
        const double *q_data = b->q + at, *qd_data = b->qd + at, *qdd_data = b->qdd + at;
        for (j = 0; j < 4; j++) {
            along(N, q_data, qd_data, qdd_data, shift[j], q, qd);
            CHECK_OK(roln_encode(m, q, qd, NULL, z, v[j], NULL, ROOM(encode)));
        }
        for (i = 0; i < n; i++)
            zdd[i] = slope(v, i);
        CHECK_OK(roln_encode(m, q_data, qd_data, NULL, z, zd, NULL, ROOM(encode)));
        CHECK_OK(roln_terms(m, z, zd, &out, ROOM(terms)));
        for (i = 0; i < F_OF(k); i++)
            tau[i] = b->tau ? b->tau[first * F_OF(k) + i] : 0;
        CHECK_OK(roln_reduce(m, z, tau, tau_z, ROOM(reduce)));
        for (i = 0; i < n; i++) {
            double r = zdd_pred[i] = tau_z[i] - c[i] - g[i] - d[i];
            for (j = 0; j < n; j++)
                r -= M[i * n + j] * zdd[j];
            t[FORCE] += (ld)(r * r) * time2 * time2;
        }
        CHECK_OK(roln_chol(n, M, M));
        roln_solve_lower(n, M, zdd_pred, zdd_pred), roln_solve_lower_t(n, M, zdd_pred, zdd_pred);
        t[ZDD] += apart(n, zdd_pred, zdd) * time2 * time2;
        CHECK_OK(roln_decode(m, z, zd, q, qd, ROOM(decode)));
        t[Q] += apart(N, q, q_data) * q2;
        t[QD] += apart(N, qd, qd_data) * q2 * time2;
        slow_decode(k, m, z, zd, zdd, qdd);
        t[QDD] += apart(N, qdd, qdd_data) * q2 * time2 * time2;
        slow_decode(k, m, z, zd, zdd_pred, qdd);
        t[QDD_PRED] += apart(N, qdd, qdd_data) * q2 * time2 * time2;
    }
}

/* The start from two positions, M(z1) zd1 = M(z_m) v + h/2 F(z_m, v), with grad_z T by differences of the kinetic energy. */
static void slow_start(int k, const roln_trained *m, const double *z0, const double *z1, const double *tau, double h, double *zd1)
{
    static const double c[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    const int n = n_OF(k);
    double zm[MAXN], v[MAXN], M[64], M1[64], g[MAXN], d[MAXN], T = 0, tau_z[MAXN], p[MAXN];
    const roln_terms_out middle = {M, NULL, g, d, &T, NULL}, end = {M1, NULL, NULL, NULL, NULL, NULL};
    const roln_terms_out kinetic = {NULL, NULL, NULL, NULL, &T, NULL};
    int i, j, s;
    for (i = 0; i < n; i++) {
        zm[i] = (z0[i] + z1[i]) / 2;
        v[i] = (z1[i] - z0[i]) / h;
    }
    CHECK_OK(roln_terms(m, zm, v, &middle, ROOM(terms)));
    CHECK_OK(roln_reduce(m, zm, tau, tau_z, ROOM(reduce)));
    CHECK_OK(roln_terms(m, z1, v, &end, ROOM(terms)));
    for (i = 0; i < n; i++) {
        const double was = zm[i];
        double slope_T = 0;
        for (s = 1; s <= 8; s++) {
            const int sign = s % 2 ? 1 : -1;
            zm[i] = was + sign * ((s + 1) / 2) * 4e-3;
            CHECK_OK(roln_terms(m, zm, v, &kinetic, ROOM(terms)));
            slope_T += sign * c[(s - 1) / 2] * T / 4e-3;
        }
        zm[i] = was;
        for (p[i] = 0, j = 0; j < n; j++)
            p[i] += M[i * n + j] * v[j];
        p[i] += h / 2 * (slope_T - g[i] - d[i] + tau_z[i]);
    }
    CHECK_OK(roln_chol(n, M1, M1));
    roln_solve_lower(n, M1, p, p), roln_solve_lower_t(n, M1, p, zd1);
}

/* The variational loss from the discrete Euler-Lagrange equations. */
static void slow_loss_positions(int k, const roln_trained *trained_k, const data *dat, ld *t)
{
    roln_model md = *models[k].md;
    const roln_trained m = trained(&md, trained_k->scale, trained_k->theta);
    const roln_batch *b = &dat->b;
    const int N = N_OF(k), n = n_OF(k), H = b->steps;
    const ld q2 = 1 / ((ld)m.scale->q * (ld)m.scale->q);
    double z[10][MAXN], still[MAXN] = {0}, none[MAXN], z_pred[MAXN], zd_pred[MAXN], tau[MAXN], q[MAXN];
    int w, h;
    md.scheme = ROLN_MIDPOINT;
    for (w = 0; w < b->count; w++)
        for (h = 0; h <= H; h++) {
            const int sample = first_of(b, w) + h * b->stride;
            const double *q_data = b->q + sample * N;
            CHECK_OK(roln_encode(&m, q_data, still, NULL, z[h], none, NULL, ROOM(encode)));
            CHECK_OK(roln_decode(&m, z[h], still, q, none, ROOM(decode)));
            t[Q] += away(k, N, q, q_data) * q2 / (H + 1);
            if (h == 0) continue;
            mean_force(b, F_OF(k), sample - b->stride, tau);
            if (h == 1) {
                slow_start(k, &m, z[0], z[1], tau, dat->h, zd_pred);
                memcpy(z_pred, z[1], sizeof z_pred);
                continue;
            }
            CHECK_OK(roln_step(&m, z_pred, zd_pred, b->tau ? tau : NULL, dat->h, spare));
            CHECK_OK(roln_decode(&m, z_pred, zd_pred, q, none, ROOM(decode)));
            t[Z] += away(k, n, z_pred, z[h]) / (H - 1);
            t[Q_PRED] += away(k, N, q, q_data) * q2 / (H - 1);
        }
}
#endif

/* ---- gradients -------------------------------------------------------------------------------- */

/* A model, data of a kind, and the gradient and loss there, to which everything else is compared. */
typedef struct {
    int k, kind, params;
    roln_real theta[MAXP], g[MAXP];
    roln_trained m;
    data d;
    terms t;
    ld top, amp; /* the largest number of g; a velocity of the variational loss is a difference of positions over h */
} subject;

static void check_loss(const subject *x)
{
    ld slow[TERMS] = {0};
    int i;
#ifdef ROLN_DOUBLE
    if (is_acc(x->kind)) slow_loss_acc(x->k, &x->m, &x->d.b, slow);
    if (is_var(x->kind)) slow_loss_positions(x->k, &x->m, &x->d, slow);
#else
    if (x->kind > ODE_FREE) return;
#endif
    if (x->kind <= ODE_FREE) slow_loss(x->k, &x->m, &x->d, slow);
    for (i = 0; i < TERMS; i++) {
        const int there = !all(1, x->t.term + i, 0);
        if (x->kind <= ODE_FREE) BOUND("loss, eps", fabsl((ld)x->t.term[i] - slow[i]) / ((slow[i] + EPS) * EPS), 100);
        else CHECK_NEAR(x->t.term[i], slow[i], 1e-8L * slow[i] + 1e-20L);
        CHECK(there == has_term[x->kind / 2][i] || models[x->k]->md->ae.layers == 0);
    }
}

#ifdef ROLN_DOUBLE
/* Every parameter by central differences of the loss, in kinds other than ODE every third. */
static void check_gradient(subject *x)
{
    static roln_real g[MAXP];
    const double h = 3e-4, move[4] = {h, -h, 2 * h, -2 * h};
    terms t;
    int i, p;
    for (i = 0; i < x->params; i++) {
        const int j = mate(x->k, i);
        const double was = x->theta[i];
        double l[4], difference;
        if (x->kind != ODE && i % 3 != x->kind % 3) continue;
        for (p = 0; p < 4; p++) {
            x->theta[i] = x->theta[j] = was + move[p];
            CHECK_OK(grad_of(x->k, &x->m, &x->d, 16, g, &t));
            l[p] = weighted(&t);
        }
        x->theta[i] = x->theta[j] = was;
        difference = (8 * (l[0] - l[1]) - (l[2] - l[3])) / (12 * h);
        BOUND("gradient", fabsl((ld)(x->g[i] + (i == j ? 0 : x->g[j])) - (ld)difference) / x->top, 1e-8);
    }
}
#else
/* Every parameter against the gradient in double. */
static void check_gradient(const subject *x)
{
    static double g[MAXP], loss[TERMS];
    int i;
    (void)weighted;
    test_roln_reference(x->k, x->kind, g, loss);
    for (i = 0; i < x->params; i++)
        BOUND("gradient, eps", fabsl((ld)x->g[i] - (ld)g[i]) / (x->top * EPS), 160 * x->amp);
    for (i = 0; i < TERMS; i++)
        BOUND("loss against double, eps", fabsl((ld)x->t.term[i] - (ld)loss[i]) / (((ld)loss[i] + EPS) * EPS), 80 * x->amp);
}
#endif

/* Blocks of one, two, sixteen windows agree; three windows are the sum of single ones, bit for bit. */
static void check_blocks(const subject *x)
{
    static roln_real g[MAXP], sum[MAXP];
    static data one;
    const int N = N_OF(x->k);
    roln_real windows = 0;
    terms t;
    roln_gradient to = roln_gradient_of(x->m.model, sum, &t.loss, &windows);
    int w, i;
    for (w = 2; w >= 1; w--) {
        CHECK_OK(grad_of(x->k, &x->m, &x->d, w, g, &t));
        BOUND("gradient in other blocks, eps", furthest(x->params, g, x->g) / (x->top * EPS), 12 * x->amp);
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(t.term[i], x->t.term[i], 20 * EPS * (ld)x->t.term[i]);
    }
    fill(x->params, 0, sum), fill(TERMS, 0, t.term);
    for (w = 0; w < 3; w++) {
        const int skip = first_of(&x->d.b, w);
        one = x->d, one.b.count = 1, one.b.start = NULL;
        one.b.q = one.q + skip * N;
        if (one.b.qd) one.b.qd = one.qd + skip * N;
        if (one.b.qdd) one.b.qdd = one.qdd + skip * N;
        if (one.b.tau) one.b.tau = one.tau + skip * F_OF(x->k);
        CHECK_OK(add_grad(x->k, &x->m, &weights.loss, &one, 16, &to));
    }
    CHECK(all(1, &windows, 3) && same(x->params, g, sum)); /* g is of blocks of one */
    CHECK_BELOW(furthest(x->params, sum, x->g) / (x->top * EPS), 12 * x->amp);
}

/* Scales that are powers of two: the model of scales 1 on scaled data gives the same bits. */
static void check_units(const subject *x)
{
    static roln_real g[MAXP];
    static data u;
    const roln_trained m = trained(x->m.model, &unit, x->theta);
    const roln_real q = scale_of(x->k)->q, c = scale.t, heavier = 4;
    const roln_scale heavy = {q, c, heavier};
    const roln_trained hm = trained(x->m.model, &heavy, x->theta);
    terms t;
    int i;
    u = x->d, u.h = x->d.h / c, u.b.q = u.q;
    u.b.qd = x->d.b.qd ? u.qd : NULL, u.b.qdd = x->d.b.qdd ? u.qdd : NULL, u.b.tau = x->d.b.tau ? u.tau : NULL;
    for (i = 0; i < MAXD; i++) {
        u.q[i] /= q;
        u.qd[i] *= c / q;
        u.qdd[i] *= c * c / q;
        u.tau[i] *= q * c * c;
    }
    CHECK_OK(grad_of(x->k, &m, &u, 16, g, &t));
    CHECK(same(x->params, g, x->g) && same(TERMS, t.term, x->t.term));
    u = x->d;
    for (i = 0; i < MAXD; i++)
        u.tau[i] *= heavier;
    u.b.tau = x->d.b.tau ? u.tau : NULL;
    CHECK_OK(grad_of(x->k, &hm, &u, 16, g, &t));
    CHECK(same(x->params, g, x->g) && same(TERMS, t.term, x->t.term));
}

static void test_gradient(int k, int kind)
{
    static subject x;
    uint64_t s = (uint64_t)(10 * k + kind);
    x.k = k, x.kind = kind, x.params = models[k].params;
    x.m = trained(models[k].md, scale_of(k), x.theta);
    CHECK(x.params <= MAXP);
    parameters(k, &s, x.theta);
    make(k, kind, 3, &s, &x.d);
    x.amp = is_var(kind) ? (ld)scale.t / (ld)x.d.h : 1;
    CHECK_OK(grad_of(k, &x.m, &x.d, 16, x.g, &x.t));
    x.top = largest(x.params, x.g);
    check_loss(&x);
    check_gradient(&x);
    check_blocks(&x);
    check_units(&x);
}

/* Weights of zero switch terms off: the gradient is linear in the weights, one term at a time. */
static void test_weights(void)
{
    static data d;
    static roln_real theta[MAXP], sum[MAXP], g[MAXP];
    const roln_trained m = trained(&plain_model, &scale, theta);
    uint64_t s = 5;
    terms t, one;
    int kind, i;
    parameters(PLAIN, &s, theta);
    for (kind = ODE; kind < KINDS; kind += 2) {
        roln_real windows = 0;
        const roln_gradient to = roln_gradient_of(&plain_model, sum, &t.loss, &windows);
        make(PLAIN, kind, 3, &s, &d);
        CHECK_OK(grad_of(PLAIN, &m, &d, 16, g, &t));
        fill(plain_theta_size, 0, sum);
        for (i = 0; i < TERMS; i++) {
            fill(TERMS, 0, one.term);
            one.term[i] = weights.term[i];
            CHECK_OK(add_grad(PLAIN, &m, &one.loss, &d, 16, &to));
        }
        CHECK_BELOW(furthest(plain_theta_size, g, sum) / (largest(plain_theta_size, g) * EPS), 40);
    }
}

/* The acceleration loss without forces is the one with forces of 0, wherever its windows begin. */
static void test_grad_acc_free(int k)
{
    static data d;
    static roln_real theta[MAXP], g[MAXP], free_g[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    uint64_t s = 25 + (uint64_t)k;
    terms t, free_t;
    int kind;
    parameters(k, &s, theta);
    for (kind = ACC; kind <= ACC_STARTS; kind++) {
        make(k, kind, 3, &s, &d);
        fill(MAXD, 0, d.tau);
        CHECK_OK(grad_of(k, &m, &d, 2, g, &t));
        d.b.tau = NULL;
        CHECK_OK(grad_of(k, &m, &d, 2, free_g, &free_t));
        CHECK(furthest(models[k].params, g, free_g) <= 0 && furthest(TERMS, t.term, free_t.term) <= 0 &&
              largest(TERMS, t.term) > 0);
    }
}

/* Windows of H < 2 positions only reconstruct; the acceleration loss and the errors need velocities. */
static void check_too_short(int k, const roln_trained *m, data *d)
{
    static const roln_loss reconstruction = {.q = 1};
    static roln_real g[MAXP];
    const int ae = roln_ae_params(&models[k].md->ae), params = models[k].params;
    roln_real windows = 0;
    roln_error e[1];
    const roln_errors_to to_e = {e, NULL};
    terms t;
    const roln_gradient to = roln_gradient_of(models[k].md, g, &t.loss, &windows);
    for (d->b.steps = 1; d->b.steps >= 0; d->b.steps--) {
        CHECK(grad_of(k, m, d, 16, g, &t) == ROLN_E_LENGTH && all(params, g, 0));
        fill(TERMS, 0, t.term);
        CHECK_OK(add_grad(k, m, &reconstruction, d, 16, &to));
        CHECK(all(params - ae, g + ae, 0) && t.loss.z <= 0 && t.loss.q_pred <= 0);
    }
    d->b.steps = 0;
    CHECK(roln_grad_acc(m, &reconstruction, &d->b, 16, &to, room_of(grad_acc_work(k, 16))) == ROLN_E_LENGTH);
    CHECK(roln_errors(m, &d->b, d->h, 16, 1, d->q, &to_e, room_of(errors_work(k, 16))) == ROLN_E_LENGTH);
}

/* Positions that the model itself made with the midpoint rule, any damping, forces and layers: no prediction error, at H = 2
   and more; and none of it without forces, or where one position is off. */
static void test_own_positions(int k)
{
    enum { H = 5 };
    static data d;
    static roln_real theta[MAXP], g[MAXP];
    roln_model md = *models[k].md;
    const roln_trained m = trained(models[k].md, scale_of(k), theta), variational = trained(&md, scale_of(k), theta);
    const int N = N_OF(k), n = n_OF(k), size = F_OF(k);
    const ld wild = k == DEEP ? 1e10L : 1;
    roln_real z[MAXN], zd[MAXN], qd[MAXN];
    uint64_t s = 110 + (uint64_t)k;
    terms t, other;
    int h;
    md.scheme = ROLN_MIDPOINT;
    parameters(k, &s, theta);
    CHECK_OK(roln_ae_init(&md.ae, theta, &s, ROOM(init)));
    make(k, VAR, 1, &s, &d);
    dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.25), &s, zd);
    dyadic((H + 1) * size, k == DEEP ? ROLN_C(0.0009765625) : ROLN_C(0.25), &s, d.tau);
    for (h = 0; h <= H; h++) {
        CHECK_OK(roln_decode(&variational, z, zd, d.q + h * N, qd, ROOM(decode)));
        if (h < H) CHECK_OK(roln_step(&variational, z, zd, d.tau + h * size, d.h, spare));
    }
    for (d.b.steps = H; d.b.steps >= 2; d.b.steps--) {
        CHECK_OK(grad_of(k, &m, &d, 16, g, &t));
        /* positions are good to eps |q|, velocities to eps |q| / h, and the steps multiply that by H: (64 H 300 eps)^2 */
        BOUND("own motion", ((ld)t.loss.z + (ld)t.loss.q_pred) / (EPS * EPS) / (wild * 1e10L), 1);
    }
    d.b.steps = H;
    if (k != DEEP) { /* a wrong force, a wrong position */
        d.tau[size] += 1;
        CHECK_OK(grad_of(k, &m, &d, 16, g, &other));
        CHECK((ld)other.loss.z > PICK(4, 1000) * (ld)t.loss.z);
        d.tau[size] -= 1, d.q[2 * N] += ROLN_C(0.0078125);
        CHECK_OK(grad_of(k, &m, &d, 16, g, &other));
        CHECK(other.loss.z > ROLN_C(1e-7));
    }
    check_too_short(k, &m, &d);
}

/* ---- variance --------------------------------------------------------------------------------- */

enum { VAR_WINDOWS = 6 };

/* Sum over the dim numbers of a field of the variance over the windows. Angles go the shorter way, their mean from the first. */
static ld variance_of(int k, int positions, int dim, roln_real field[VAR_WINDOWS][MAXN])
{
    ld var = 0;
    int i, w;
    for (i = 0; i < dim; i++) {
        const ld first = (ld)field[0][i];
        ld mean = first;
        for (w = 0; w < VAR_WINDOWS; w++)
            mean += (positions ? difference(k, i, (ld)field[w][i], first) : (ld)field[w][i] - first) / VAR_WINDOWS;
        for (w = 0; w < VAR_WINDOWS; w++) {
            const ld off = positions ? difference(k, i, (ld)field[w][i], mean) : (ld)field[w][i] - mean;
            var += off * off / VAR_WINDOWS;
        }
    }
    return var;
}

/* Variance of the data of every term, slowly. */
static void slow_variance(int k, const roln_trained *m, const data *d, ld *var)
{
    static roln_real x[TERMS][VAR_WINDOWS][MAXN]; /* Q .. ZDD */
    const int N = N_OF(k), n = n_OF(k);
    int w, j;
    for (w = 0; w < VAR_WINDOWS; w++) {
        const int at = first_of(&d->b, w) * N;
        memcpy(x[Q][w], d->q + at, (size_t)N * sizeof(roln_real)), memcpy(x[QD][w], d->qd + at, (size_t)N * sizeof(roln_real));
        memcpy(x[QDD][w], d->qdd + at, (size_t)N * sizeof(roln_real));
        CHECK_OK(roln_encode(m, x[Q][w], x[QD][w], x[QDD][w], x[Z][w], x[ZD][w], x[ZDD][w], ROOM(aim)));
    }
    for (j = 0; j < 3; j++) {
        const ld time = powl((ld)scale.t, j), q = time / (ld)scale_of(k)->q;
        const int there = j == 0 || (j == 1 && d->b.qd) || (j == 2 && d->b.qdd);
        var[Q + j] = var[Q_PRED + j] = there ? variance_of(k, j == 0, N, x[Q + j]) * q * q : 1;
        var[Z + j] = there ? variance_of(k, j == 0, n, x[Z + j]) * time * time : 1;
    }
    var[FORCE] = 1;
}

/* A linear autoencoder, the same in other units (slope 1, biases along): the loss in parts of the variance is the same. */
static void test_variance_units(void)
{
    static const roln_scale other = {8, ROLN_C(0.125), 1};
    static data d;
    static roln_real theta[MAXP], g[MAXP];
    const int N = pole_N;
    uint64_t s = 120 + POLE;
    roln_loss var = {0};
    terms loss[2], part[2];
    roln_real windows = 0;
    int i, j;
    parameters(POLE, &s, theta);
    make(POLE, ODE, 6, &s, &d);
    d.b.steps = 0;
    for (i = 0; i < 2; i++) {
        const roln_trained m = trained(&pole_model, i ? &other : &scale, theta);
        const roln_gradient to = roln_gradient_of(&pole_model, g, &loss[i].loss, &windows);
        for (j = 2 * N; j < 3 * N && i; j++)
            theta[j] *= scale.q / other.q;
        fill(TERMS, 0, loss[i].term), part[i] = weights;
        CHECK_OK(roln_variance(&m, &d.b, &var, room_of(models[POLE].scratch.variance)));
        CHECK_OK(add_grad(POLE, &m, &weights.loss, &d, 16, &to));
        roln_loss_divide(&part[i].loss, &var);
    }
    CHECK(loss[0].loss.q > 2 * loss[1].loss.q && loss[0].loss.qd > 2 * loss[1].loss.qd);
    CHECK_NEAR(roln_loss_total(&part[0].loss, &loss[0].loss) / roln_loss_total(&part[1].loss, &loss[1].loss), 1, 20 * EPS);
}

static void test_variance(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    uint64_t s = 120 + (uint64_t)k;
    int kind, i;
    parameters(k, &s, theta);
    for (kind = 0; kind < KINDS; kind++) {
        terms got = {0}, was, part = weights;
        ld var[TERMS];
        make(k, kind, VAR_WINDOWS, &s, &d);
        slow_variance(k, &m, &d, var);
        CHECK_OK(roln_variance(&m, &d.b, &got.loss, ROOM(variance)));
        ROOM_KEPT();
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(got.term[i], var[i], 200 * EPS * var[i]);
        roln_loss_divide(&part.loss, &got.loss);
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(part.term[i] * got.term[i], weights.term[i], 4 * EPS);
        was = got;
        d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)NAN;
        CHECK(roln_variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)INFINITY;
        CHECK(roln_variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        fill(MAXD, 0, d.q); /* at rest */
        CHECK(roln_variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        CHECK(same(TERMS, was.term, got.term));
    }
}

/* ---- unit of inertia -------------------------------------------------------------------------- */

/* rms tau_z / rms zdd, tau_z = J^T tau, in J s^2; with inputs u in place of it. */
static ld slow_ratio(int k, const roln_trained *m, const data *d)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), inputs = m->model->inputs;
    ld force = 0, motion = 0;
    int w, i;
    for (w = 0; w < d->b.count; w++) {
        const int at = first_of(&d->b, w);
        const roln_real *tau = d->b.tau + at * F;
        roln_real z[MAXN], zd[MAXN], zdd[MAXN], tau_z[MAXN];
        CHECK_OK(roln_encode(m, d->b.q + at * N, d->b.qd + at * N, d->b.qdd + at * N, z, zd, zdd, ROOM(aim)));
        CHECK_OK(roln_reduce(m, z, tau, tau_z, ROOM(reduce)));
        for (i = 0; i < (inputs ? inputs : n); i++) {
            const ld f = inputs ? (ld)tau[i] * (ld)m->scale->q : (ld)tau_z[i];
            force += f * f;
        }
        for (i = 0; i < n; i++)
            motion += (ld)zdd[i] * (ld)zdd[i];
    }
    return sqrtl(force / motion);
}

/* Torques a thousand times as large: a unit a thousand times as large. All that training sees stays as it was (check_units). */
static void test_fit_inertia(int k)
{
    static data d, was;
    static roln_real theta[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    const roln_real odd[3] = {(roln_real)NAN, (roln_real)INFINITY, 0};
    roln_real unit_of_it = 7, large, x = 1;
    uint64_t s = 130 + (uint64_t)k;
    ld ratio;
    int power, i;
    parameters(k, &s, theta);
    make(k, ACC, 3, &s, &was);
    ratio = slow_ratio(k, &m, &was);
    for (power = -4; power <= 4; power++) {
        d = was, d.b.q = d.q, d.b.qd = d.qd, d.b.qdd = d.qdd, d.b.tau = d.tau;
        large = (roln_real)powl(1024, power);
        for (i = 0; i < MAXD; i++)
            d.tau[i] *= large;
        CHECK_OK(roln_fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)));
        ROOM_KEPT();
        CHECK(fabsl(log2l(ratio * (ld)large / (ld)unit_of_it)) <= 5 * (1 + 20 * EPS));
        x = power == -4 ? unit_of_it : x * 1024;
        CHECK(all(1, &unit_of_it, x) && fabsl(log2l((ld)x) / 10 - roundl(log2l((ld)x) / 10)) < 1e-9L);
    }
    for (i = 0; i < 3; i++) { /* no torque, none that is a number */
        fill(MAXD, odd[i], d.tau);
        CHECK(roln_fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE && all(1, &unit_of_it, x));
    }
    d = was, d.b.q = d.q, d.b.qd = d.qd, d.b.qdd = d.qdd, d.b.tau = d.tau;
    d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)NAN;
    CHECK(roln_fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE);
    for (i = 0; i < 4; i++) {
        roln_batch b = was.b;
        if (i == 0) b.tau = NULL;
        if (i == 1) b.qd = NULL;
        if (i == 2) b.qdd = NULL;
        if (i == 3) b.count = 0;
        CHECK(roln_fit_inertia(&m, &b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_LENGTH);
    }
    CHECK(all(1, &unit_of_it, x));
    was.b.count = 1; /* a window, its first sample: what comes behind it does not count */
    CHECK_OK(roln_fit_inertia(&m, &was.b, &x, ROOM(fit_inertia)));
    for (i = 0; i < MAXD; i++)
        if (i / F_OF(k) != first_of(&was.b, 0)) was.tau[i] = (roln_real)NAN;
    CHECK(roln_fit_inertia(&m, &was.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_OK && all(1, &unit_of_it, x));
}

/* ---- roll-outs -------------------------------------------------------------------------------- */

/* Energy gained = work of the force (Simpson), over 200 steps of rk4. */
static void test_rollout(void)
{
    enum { STEPS = 200 };
    static roln_real theta[MAXP];
    const roln_trained m = trained(&plain_model, &scale, theta);
    const roln_real h = PICK(ROLN_C(0.015625), 0.00390625);
    roln_real z[2], zd[2], tau[6], tau_z[2], T = 0, V = 0;
    const roln_terms_out energies = {NULL, NULL, NULL, NULL, &T, &V};
    uint64_t s = 60;
    ld start = 0, work = 0, moved = 0;
    int k;
    parameters(PLAIN, &s, theta);
    dyadic(6, 1, &s, tau), dyadic(2, 1, &s, z), dyadic(2, 1, &s, zd);
    for (k = 0; k <= STEPS; k++) {
        ld power;
        CHECK_OK(roln_terms(&m, z, zd, &energies, room_of(NUMBERS_OF(plain_work, terms))));
        CHECK_OK(roln_reduce(&m, z, tau, tau_z, room_of(NUMBERS_OF(plain_work, reduce))));
        power = (ld)tau_z[0] * (ld)zd[0] + (ld)tau_z[1] * (ld)zd[1];
        if (k == 0) start = (ld)T + (ld)V;
        work += (ld)h * power * (k == 0 || k == STEPS ? 1 : k % 2 ? 4 : 2) / 3;
        moved += fabsl(power) * (ld)h;
        if (k < STEPS) CHECK_OK(roln_step(&m, z, zd, tau, h, room_of(NUMBERS_OF(plain_work, step))));
    }
    BOUND("energy of a roll-out", fabsl((ld)T + (ld)V - start - work) / moved, PICK(4e-6, 1e-8));
    CHECK(fabsl((ld)T + (ld)V - start) > 0.05L * moved);
}

enum { MAXE = 10 };

/* Adds the errors of joint i in window w, sample by sample, to ref [MAXE][4]. */
static void slow_errors(int k, const roln_trained *m, const data *d, int w, int every, const roln_real *qbar, int i,
                        ld ref[MAXE][4])
{
    const int N = N_OF(k), first = first_of(&d->b, w);
    roln_real z[MAXN], zd[MAXN], q[MAXN], qd[MAXN];
    int h, j;
    CHECK_OK(roln_encode(m, d->q + first * N, d->qd + first * N, NULL, z, zd, NULL, ROOM(encode)));
    for (h = 0; h <= d->b.steps; h++) {
        const roln_real *q_data = d->q + (first + h) * N, *qd_data = d->qd + (first + h) * N;
        if (h > 0) CHECK_OK(roln_step(m, z, zd, d->tau + (first + h - 1) * F_OF(k), d->h, ROOM(step)));
        if (h % every != 0) continue;
        CHECK_OK(roln_decode(m, z, zd, q, qd, ROOM(decode)));
        {
            const ld e[4] = {difference(k, i, (ld)q[i], (ld)q_data[i]), difference(k, i, (ld)q_data[i], (ld)qbar[i]),
                             (ld)qd[i] - (ld)qd_data[i], (ld)qd_data[i]};
            for (j = 0; j < 4; j++)
                ref[h / every][j] += e[j] * e[j];
        }
    }
}

/* The sums got are those of ref, to rounding. */
static void check_errors(int k, const roln_error *got, int stride, ld ref[MAXE][4])
{
    int i, j;
    for (i = 0; i < MAXE; i++, got += stride) {
        const double sums[4] = {got->q, got->q_var, got->qd, got->qd_var};
        for (j = 0; j < 4; j++)
            CHECK_NEAR(sums[j], ref[i][j], 60 * EPS * (ref[i][j] + (k == BARE ? 1 : 0)));
    }
}

static void test_errors(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    roln_real qbar[MAXN];
    uint64_t s = 70;
    int w, i, j, every, nb;
    parameters(k, &s, theta);
    make(k, ODE, 5, &s, &d);
    for (i = 0; i < MAXD; i++)
        d.qd[i] /= 8, d.tau[i] /= 8;
    dyadic(N_OF(k), 1, &s, qbar);
    for (every = 1; every <= 2; every++)
        for (nb = 1; nb <= 16; nb += 3) {
            ld all_joints[MAXE][4] = {{0}};
            roln_error e[MAXE], joints[MAXE * MAXN], alone[MAXE];
            const roln_errors_to to = {e, joints}, sums = {alone, NULL};
            memset(e, 0, sizeof e), memset(joints, 0, sizeof joints), memset(alone, 0, sizeof alone);
            CHECK_OK(roln_errors(&m, &d.b, d.h, nb, every, qbar, &to, room_of(errors_work(k, nb))));
            ROOM_KEPT();
            CHECK_OK(roln_errors(&m, &d.b, d.h, nb, every, qbar, &sums, room_of(errors_work(k, nb))));
            CHECK(memcmp(e, alone, sizeof e) == 0);
            for (j = 0; j < N_OF(k); j++) {
                ld ref[MAXE][4] = {{0}};
                for (w = 0; w < 5; w++)
                    slow_errors(k, &m, &d, w, every, qbar, j, ref);
                for (i = 0; i < 4 * MAXE; i++)
                    all_joints[i / 4][i % 4] += ref[i / 4][i % 4];
                check_errors(k, joints + j, N_OF(k), ref);
            }
            check_errors(k, e, 1, all_joints);
        }
    /* a step that fails ends the call: the errors before it are there, those behind it are not */
    {
        roln_error e[MAXE];
        const roln_errors_to to = {e, NULL};
        memset(e, 0, sizeof e);
        d.tau[(d.b.steps - 1) * F_OF(k)] = (roln_real)INFINITY; /* last step of the first window */
        CHECK(roln_errors(&m, &d.b, d.h, 16, 1, qbar, &to, room_of(errors_work(k, 16))) == ROLN_E_NOT_FINITE);
        CHECK(e[0].q_var > 0 && e[d.b.steps - 1].q_var > 0 && e[d.b.steps].q_var <= 0);
    }
}

/* A block that fails adds nothing: NaN and infinity in every number of the second window, nb = 1. */
static void test_grad_failures(int k, int kind)
{
    static data d;
    static roln_real theta[MAXP], g[MAXP], first[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    const int params = models[k].params;
    const struct {
        roln_real *x;
        int size, skip;
    } fields[4] = {{d.q, N_OF(k), 0},
                   {d.qd, N_OF(k), is_var(kind)},
                   {d.qdd, N_OF(k), !is_acc(kind)},
                   {d.tau, F_OF(k), kind == ODE_FREE || kind == ACC_STARTS || kind == VAR_FREE}}; /* kind 3: windows share forces */
    uint64_t s = 81;
    terms t;
    int i, f, b, length;
    parameters(k, &s, theta);
    make(k, kind, 2, &s, &d);
    length = d.b.steps * d.b.stride + 1;
    d.b.start = NULL;
    d.b.count = 1;
    CHECK_OK(grad_of(k, &m, &d, 1, first, &t));
    d.b.count = 2;
    for (f = 0; f < 4; f++) {
        const int size = fields[f].size, last = f == 3 && !is_acc(kind); /* no step begins at the last sample */
        if (fields[f].skip) continue;
        for (i = length * size; i < (2 * length - last) * size; i++)
            for (b = 0; b < 2; b++) {
                roln_real *x = fields[f].x + i;
                const roln_real was = *x;
                if (kind % 2 && !is_acc(kind) && (i / size - length) % 2) continue; /* skipped by the stride */
                *x = (roln_real)(b ? NAN : INFINITY);
                CHECK(grad_of(k, &m, &d, 1, g, &t) == ROLN_E_NOT_FINITE && same(params, g, first));
                *x = was;
            }
    }
    for (i = 0; i < params; i++) { /* so does a broken parameter, whether it matters or not */
        const roln_real was = theta[i];
        theta[i] = (roln_real)NAN;
        CHECK(grad_of(k, &m, &d, 16, g, &t) == ROLN_E_NOT_FINITE && all(params, g, 0));
        theta[i] = was;
    }
}

/* ---- rows of residuals ------------------------------------------------------------------------ */

/* Residuals r [count] of d.b and, unless J is NULL, their rows: of all parameters, or of those behind the autoencoder. */
static roln_status rows_of(int k, const roln_trained *m, const roln_loss *wt, const data *d, const roln_rows_to *to)
{
    const int acc = d->b.qdd != NULL && d->b.steps == 0;
    const roln_status st = roln_rows(m, wt, &d->b, d->h, to,
                                     room_of(acc ? grad_acc_work(k, 1) : grad_work(k, 1, d->b.steps > 0 ? d->b.steps : 0)));
    ROOM_KEPT();
    return st;
}

/* A model, two windows of a kind, the second of them again where windows may be listed, their rows and residuals. */
enum { ROWS = 3 };
typedef struct {
    int k, kind, params, count;
    roln_real theta[MAXP], J[ROWS * MAXP], r[ROWS];
    roln_trained m;
    data d;
} rows_subject;

static void rows_make(int k, int kind, rows_subject *x)
{
    const roln_rows_to to = {x->J, x->r, 0, 40};
    uint64_t s = (uint64_t)(1000 + 10 * k + kind);
    x->k = k, x->kind = kind, x->params = models[k].params;
    x->m = trained(models[k].md, scale_of(k), x->theta);
    parameters(k, &s, x->theta);
    make(k, kind, 2, &s, &x->d);
    if (x->d.b.start) x->d.b.count = 3, x->d.start[2] = x->d.start[1];
    x->count = x->d.b.count;
    fill(ROWS * MAXP, 7, x->J), fill(ROWS, 7, x->r);
    CHECK_OK(rows_of(k, &x->m, &weights.loss, &x->d, &to));
}

void test_roln_rows_reference(int k, int kind, double *J, double *r);
#ifdef ROLN_DOUBLE
void test_roln_rows_reference(int k, int kind, double *J, double *r)
{
    static rows_subject x;
    rows_make(k, kind, &x);
    memcpy(J, x.J, sizeof x.J), memcpy(r, x.r, sizeof x.r);
}

/* In parts of the largest number of its row, so that what is compared is of order one. */
static double minus_residual(void *ctx)
{
    const rows_subject *x = (const rows_subject *)ctx;
    roln_real r[ROWS];
    const roln_rows_to to = {NULL, r, 0, 40};
    CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to));
    return -r[0] / (double)largest(x->params, x->J);
}

/* Every row by central differences of -r in every parameter, in kinds other than ODE every third; the first also with half the
   step. */
static void check_rows_slope(rows_subject *x)
{
    const double h = 1e-4, move[4] = {h, -h, 2 * h, -2 * h};
    static double row[MAXP];
    double v[4][ROWS];
    int i, w, p;
    for (i = 0; i < x->params; i++) {
        const int j = mate(x->k, i);
        const double was = x->theta[i];
        if (x->kind != ODE && i % 3 != x->kind % 3) continue;
        for (p = 0; p < 4; p++) {
            const roln_rows_to to = {NULL, v[p], 0, 40};
            x->theta[i] = x->theta[j] = was + move[p];
            CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to));
        }
        x->theta[i] = x->theta[j] = was;
        for (w = 0; w < x->count; w++) {
            const double *J = x->J + w * x->params, got = J[i] + (i == j ? 0 : J[j]);
            const double want = -(8 * (v[0][w] - v[1][w]) - (v[2][w] - v[3][w])) / (12 * h);
            BOUND("rows", fabsl((ld)got - (ld)want) / largest(x->params, J), 2e-8);
        }
    }
    for (i = 0; i < x->params && mate(x->k, i) == i; i++)
        row[i] = x->J[i] / (double)largest(x->params, x->J);
    if (x->k == WHEEL && is_var(x->kind)) return; /* rounding there is as large as the error of such differences */
    if (i == x->params && x->kind % 2 == 0) check_halving(x->params, row, x->theta, 1e-3, minus_residual, x);
}
#else
/* Every row against that in double; a residual is a sum of errors of either sign, which the loss adds as squares. */
static void check_rows_slope(const rows_subject *x)
{
    static double J[ROWS * MAXP], r[ROWS];
    const ld amp = is_var(x->kind) ? (ld)scale.t / (ld)x->d.h : 1;
    terms t = {0};
    ld size;
    static roln_real g[MAXP];
    int i, w;
    test_roln_rows_reference(x->k, x->kind, J, r);
    CHECK_OK(grad_of(x->k, &x->m, &x->d, 16, g, &t));
    size = sqrtl((ld)weighted(&t));
    for (w = 0; w < x->count; w++) {
        const roln_real *row = x->J + w * x->params;
        BOUND("residuals, eps", fabsl((ld)x->r[w] - (ld)r[w]) / (size * EPS), 30 * amp);
        for (i = 0; i < x->params; i++)
            BOUND("rows, eps", fabsl((ld)row[i] - (ld)J[w * x->params + i]) / (largest(x->params, row) * EPS), 160 * amp);
    }
}
#endif

/* The same bits: residuals alone, the rows of the networks alone, one window at a time; others for other signs. */
static void check_rows_bits(const rows_subject *x)
{
    static roln_real J[ROWS * MAXP], tail[ROWS * MAXP];
    static data one;
    roln_real r[ROWS];
    const int N = N_OF(x->k), P = x->params, ae = roln_ae_params(&models[x->k]->md->ae), rest = P - ae, count = x->count;
    roln_rows_to to = {NULL, r, 0, 40};
    int w;
    fill(ROWS, 7, r);
    CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to));
    CHECK(same(count, r, x->r) && all(ROWS - count, r + count, 7));
    CHECK(all((ROWS - count) * P, x->J + count * P, 7)); /* nothing behind the last row */
    for (to.behind = 0; to.behind < 2; to.behind++) {
        fill(ROWS, 7, r), fill(ROWS * MAXP, 7, tail);
        to.J = to.behind ? tail : J;
        CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to));
        CHECK(same(count, r, x->r));
    }
    CHECK(same(count * P, J, x->J) && all(ROWS * MAXP - count * rest, tail + count * rest, 7));
    for (w = 0; w < count; w++) {
        const int skip = first_of(&x->d.b, w);
        CHECK(same(rest, tail + w * rest, x->J + w * P + ae));
        one = x->d, one.b.count = 1, one.b.start = NULL;
        one.b.q = one.q + skip * N;
        if (one.b.qd) one.b.qd = one.qd + skip * N;
        if (one.b.qdd) one.b.qdd = one.qdd + skip * N;
        if (one.b.tau) one.b.tau = one.tau + skip * F_OF(x->k);
        to.J = J, to.behind = 0, to.seed = 40 + (uint64_t)w;
        CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &one, &to));
        CHECK(same(1, r, x->r + w) && same(P, J, x->J + w * P));
        to.seed = 90;
        CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &one, &to));
        CHECK(!same(P, J, x->J + w * P));
    }
    if (count == 3) CHECK(!same(P, x->J + P, x->J + 2 * P)); /* the same window */
}

/* Parameters and data are as they were; no window, no row. */
static void check_rows_kept(const rows_subject *x)
{
    static rows_subject again;
    roln_real r = 7, J = 7;
    const roln_rows_to to = {&J, &r, 0, 40};
    uint64_t s = (uint64_t)(1000 + 10 * x->k + x->kind);
    data *d = &again.d;
    parameters(x->k, &s, again.theta);
    make(x->k, x->kind, 2, &s, d);
    CHECK(same(x->params, x->theta, again.theta) && same(MAXD, x->d.q, d->q) && same(MAXD, x->d.qd, d->qd));
    CHECK(same(MAXD, x->d.qdd, d->qdd) && same(MAXD, x->d.tau, d->tau));
    d->b.count = 0;
    CHECK_OK(rows_of(x->k, &x->m, &weights.loss, d, &to));
    CHECK(all(1, &r, 7) && all(1, &J, 7));
}

/* A window that fails: its status, an infinite residual, those before it as they are. Arguments that are none. */
static void check_rows_status(rows_subject *x)
{
    static roln_real J[ROWS * MAXP];
    const int N = N_OF(x->k), length = x->d.b.steps * x->d.b.stride + 1, P = x->params;
    roln_real r[ROWS], *const fields[4] = {x->d.q, x->d.qd, x->d.qdd, x->d.tau};
    const int skip[4] = {0, is_var(x->kind), !is_acc(x->kind), x->d.b.tau == NULL};
    roln_rows_to to = {J, r, 0, 40};
    const roln_batch b = x->d.b;
    int f, i;
    x->d.b.start = NULL, x->d.b.count = 2;
    for (f = 0; f < 4; f++)
        for (i = 0; i < 4 && !skip[f]; i++) {
            const int size = f == 3 ? F_OF(x->k) : N;
            roln_real *at = fields[f] + length * size + i % size, was = *at;
            *at = (roln_real)(i % 2 ? NAN : INFINITY);
            to.J = i < 2 ? J : NULL, fill(ROWS, 7, r);
            CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_NOT_FINITE);
            CHECK(roln_finite(r[0]) && !all(1, r, 7) && !roln_finite(r[1]) && all(ROWS - 2, r + 2, 7));
            *at = was;
        }
    to.J = J, fill(ROWS, 7, r), fill(ROWS * MAXP, 7, J);
    for (i = 0; i < P; i += 1 + P / 20) {
        const roln_real was = x->theta[i];
        x->theta[i] = (roln_real)NAN;
        CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_NOT_FINITE);
        x->theta[i] = was;
    }
    x->d.b.count = -1;
    CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_LENGTH);
    x->d.b.count = 1, x->d.b.stride = 0;
    CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_LENGTH);
    x->d.b.stride = 1, x->d.b.steps = -1;
    CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_LENGTH);
    x->d.b.steps = 1 - is_acc(x->kind), x->d.b.qd = NULL; /* the acceleration loss needs them; others two steps of positions */
    CHECK(rows_of(x->k, &x->m, &weights.loss, &x->d, &to) == ROLN_E_LENGTH);
    CHECK(all(ROWS, r, 7) && all(ROWS * MAXP, J, 7));
    x->d.b = b;
}

/* The loss and -1/2 of its gradient are the means of r^2 and r J over all signs: over all patterns of the few signs of one term,
   each    found by drawing, exactly. K numbers are compared. */
enum { MOST = 6, PATTERNS = 1 << MOST };
static void check_patterns(const rows_subject *x, int term, int K)
{
    static roln_real row[MAXP], g[MAXP];
    static ld mean[MAXP];
    static uint64_t seen[PATTERNS];
    roln_real r, windows = 0;
    roln_rows_to to = {row, &r, 0, 0};
    terms wt = {0}, t = {0};
    const roln_gradient gradient = roln_gradient_of(x->m.model, g, &t.loss, &windows);
    ld loss = 0, want, top, amp = is_var(x->kind) ? (ld)scale.t / (ld)x->d.h : 1;
    int found = 0, i;
    wt.term[term] = weights.term[term];
    fill(MAXP, 0, g), memset(mean, 0, sizeof mean);
    CHECK_OK(add_grad(x->k, &x->m, &wt.loss, &x->d, 1, &gradient));
    want = (ld)wt.term[term] * (ld)t.term[term], top = largest(x->params, g) + 1e-30L;
    for (to.seed = 1; to.seed < 20u << K && found < 1 << K; to.seed++) {
        uint64_t mark;
        CHECK_OK(rows_of(x->k, &x->m, &wt.loss, &x->d, &to));
        mark = roln_fnv((int)((size_t)x->params * sizeof *row), (const unsigned char *)row, ROLN_FNV);
        for (i = 0; i < found && seen[i] != mark; i++) {}
        if (i < found) continue;
        seen[found++] = mark;
        loss += (ld)r * (ld)r / (1 << K);
        for (i = 0; i < x->params; i++)
            mean[i] += (ld)r * (ld)row[i] / (1 << K);
    }
    CHECK(found == 1 << K);
    BOUND("mean of r^2, eps", fabsl(loss - want) / (want * EPS + 1e-30L), 6);
    for (i = 0; i < x->params; i++)
        BOUND("mean of r J, eps", fabsl(2 * mean[i] + (ld)g[i]) / (top * EPS), 60 * amp);
}

static void check_all_patterns(const rows_subject *x)
{
    static rows_subject one;
    const int N = N_OF(x->k), n = n_OF(x->k), H = is_acc(x->kind) ? 0 : 1 + is_var(x->kind), ahead = is_var(x->kind) ? 1 : H;
    const int bent = models[x->k]->md->ae.layers > 0;
    int term;
    one = *x, one.m.theta = one.theta;
    one.d.b.count = 1, one.d.b.steps = H, one.d.b.start = NULL, one.d.b.q = one.d.q;
    if (x->d.b.qd) one.d.b.qd = one.d.qd;
    if (x->d.b.qdd) one.d.b.qdd = one.d.qdd;
    if (x->d.b.tau) one.d.b.tau = one.d.tau;
    for (term = 0; term < TERMS; term++) {
        const int predicted = term == Z || term == ZD || term == Q_PRED || term == QD_PRED;
        const int latent = term == Z || term == ZD || term == ZDD || term == FORCE;
        const int K = (latent ? n : N) * (is_acc(x->kind) ? 1 : predicted ? ahead : H + 1);
        if (!has_term[x->kind / 2][term] || (!bent && term <= QDD) || K > MOST) continue;
        check_patterns(&one, term, K);
    }
}

/* The same of all terms together, over many signs: within five standard errors. */
static void check_means(const rows_subject *x, int draws)
{
    static roln_real row[MAXP], g[MAXP];
    static ld mean[MAXP], square[MAXP];
    roln_real r;
    roln_rows_to to = {row, &r, 0, 0};
    data d = x->d;
    terms t = {0};
    ld loss = 0, want, along = 0, size = 0;
    int i, k;
    d.b.count = 1;
    CHECK_OK(grad_of(x->k, &x->m, &d, 1, g, &t));
    want = (ld)weighted(&t);
    memset(mean, 0, sizeof mean), memset(square, 0, sizeof square);
    for (k = 0; k < draws; k++, to.seed++) {
        CHECK_OK(rows_of(x->k, &x->m, &weights.loss, &d, &to));
        loss += (ld)r * (ld)r / draws;
        for (i = 0; i < x->params; i++) {
            const ld y = (ld)r * (ld)row[i];
            mean[i] += y / draws, square[i] += y * y / draws;
        }
    }
    BOUND("mean of r^2, standard errors", fabsl(loss - want) / (want * sqrtl(2.0L / draws)), 5); /* E r^4 <= 3 (E r^2)^2 */
    for (i = 0; i < x->params; i++) {
        const ld error = sqrtl((square[i] - mean[i] * mean[i]) / draws);
        BOUND("mean of r J, standard errors", fabsl(mean[i] + (ld)g[i] / 2) / (error + 1e-30L), 5);
        along -= 2 * mean[i] * (ld)g[i], size += (ld)g[i] * (ld)g[i];
    }
    CHECK_NEAR(along / size, 1, 0.2);
}

static void test_rows(int k, int kind)
{
    static rows_subject x;
    rows_make(k, kind, &x);
    check_rows_slope(&x);
    check_rows_bits(&x);
    check_rows_kept(&x);
    check_all_patterns(&x);
    if (kind % 2 == 0 && (k == PLAIN || k == RICH || k == PUSHED || k == CURVED)) check_means(&x, 1000);
    check_rows_status(&x);
}

/* More numbers than a draw has bits: every sign is drawn, and the three outputs agree. */
static void test_signs(void)
{
    enum { n = 200 };
    roln_real a[n], b[n], left[n], right[n], ga[n], gb[n], r = 1, sum = 7;
    const roln_real f = ROLN_C(0.25), weight = 4; /* sqrt(f weight) = 1 */
    uint64_t s = 31, signs;
    const roln_gradient g = {NULL, NULL, NULL, NULL, &signs, &r, NULL};
    ld want = 1;
    int i, up[3] = {0, 0, 0}, alike[2] = {0, 0};
    dyadic(n, 1, &s, a), dyadic(n, 1, &s, b), dyadic(n, 1, &s, left), dyadic(n, 1, &s, right);
    memcpy(ga, left, sizeof ga), memcpy(gb, right, sizeof gb), signs = s;
    rolni_compare(&g, rolni_term_of(f, weight, &sum), n, a, b, ga, gb);
    CHECK(signs != s && all(1, &sum, 7));
    for (i = 0; i < n; i++) {
        ga[i] -= left[i], gb[i] -= right[i];
        CHECK(ROLN_ABS(ga[i]) <= 1 && ROLN_ABS(ga[i]) >= 1 && ga[i] + gb[i] <= 0 && ga[i] + gb[i] >= 0);
        want -= (ld)ga[i] * ((ld)a[i] - (ld)b[i]);
        if (i < 192) up[i / 64] += ga[i] > 0;
        if (i >= 64 && i < 192) alike[i / 64 - 1] += (ga[i] > 0) == (ga[i - 64] > 0);
    }
    CHECK_NEAR(r, want, 200 * EPS);
    for (i = 0; i < 3; i++)
        CHECK(up[i] > 12 && up[i] < 52);
    for (i = 0; i < 2; i++)
        CHECK(alike[i] > 12 && alike[i] < 52);
    signs = 5, r = 1; /* a weight of 0 asks for nothing and draws nothing */
    rolni_compare(&g, rolni_term_of(f, 0, &sum), n, a, b, ga, gb);
    CHECK(signs == 5 && all(1, &r, 1));
}

/* ---- packed parameters ------------------------------------------------------------------------ */

enum { MAXB = 16000, MAXNUM = MAXP + 64 };

static void random_bits(int n, uint64_t *s, roln_real *x)
{
    while (n > 0) {
        const uint64_t r = roln_rand(s);
        memcpy(x, &r, sizeof *x);
        if (roln_finite(*x)) x++, n--;
    }
}

/* Packed parameters of a model, and where their parts are. */
typedef struct {
    const roln_model *md;
    int n, own, sizes, lead, total, numbers; /* own units; sizes in the head; bytes before slope; all bytes; of NAME_params */
    roln_real x[MAXNUM], to[MAXNUM];    /* packed; where they are unpacked to */
    unsigned char bytes[MAXB], bad[MAXB];
} package;

static void package_of(const roln_model *md, package *p)
{
    const roln_lnn *f = &md->lnn;
    p->md = md, p->n = f->n, p->own = md->own ? md->ae.size[0] : 0;
    p->sizes = 8 + md->ae.layers + f->mass_net.layers + 2 * f->layers + (f->angles ? 2 : 0);
    p->lead = 8 + 2 * p->sizes;
    p->total = ROLN_PACKED(md->ae.layers, f->mass_net.layers, f->layers, f->angles, p->own, f->n, roln_params(md));
    p->numbers = 6 + p->own + 3 * f->n + roln_params(md);
    CHECK(p->total <= MAXB - 8 && p->numbers <= MAXNUM);
}

/* Packs x; bad is the same, to is full of 7. */
static void seal(package *p)
{
    memset(p->bytes, 0xa5, sizeof p->bytes);
    roln_pack(p->md, p->x, p->bytes);
    CHECK(p->bytes[p->total] == 0xa5);
    memcpy(p->bad, p->bytes, sizeof p->bad);
    fill(MAXNUM, 7, p->to);
}

/* Unpacks bad; unless ROLN_OK nothing may be written. */
static roln_status unpack(package *p, int count)
{
    const roln_status st = roln_unpack(p->md, count, p->bad, p->to);
    CHECK(st == ROLN_OK || all(MAXNUM, p->to, 7));
    return st;
}

/* The same with number i of bad set to y, under a true checksum. */
static roln_status unpack_with(package *p, int i, roln_real y)
{
    const int at = p->lead + i * (int)sizeof y;
    unsigned char *sum = p->bad + p->total - 8;
    roln_status st;
    memcpy(p->bad + at, &y, sizeof y);
    rolni_put(&sum, roln_fnv(p->total - 8, p->bad, ROLN_FNV), 8);
    st = unpack(p, p->total);
    memcpy(p->bad, p->bytes, sizeof p->bad);
    return st;
}

/* Every byte corrupted: in the leading bytes and behind `edge` of them in every way, elsewhere in a way or two and now and then. */
static void check_corruption(package *p, int edge, int all_of)
{
    int i, j;
    for (i = 0; i < p->total; i++)
        for (j = 1; j < 256; j++) {
            const int here = i < p->lead + edge || (edge > 0 && i >= p->total - 9) || i % all_of == 0;
            roln_status want = ROLN_E_CHECKSUM;
            if (i < p->lead) want = ROLN_E_SHAPE;
            if (i == 6) want = ROLN_E_PRECISION;
            if (i < 6) want = ROLN_E_FORMAT;
            if (!here && j != 1 << (i % 8) && (edge <= 0 || j != 255)) continue;
            p->bad[i] ^= (unsigned char)j;
            CHECK(unpack(p, p->total) == want);
            p->bad[i] = p->bytes[i];
        }
}

/* The sizes in the head, in this order, 16 bits each; slope and least lead the numbers. */
static void check_head(const package *p, int bits)
{
    const roln_model *md = p->md;
    const roln_lnn *f = &md->lnn;
    int want[64], c = 0, i;
    CHECK(memcmp(p->bytes, "ROLN\3\0", 6) == 0 && p->bytes[6] == sizeof(roln_real) && p->bytes[7] == p->sizes);
    want[c++] = md->scheme, want[c++] = md->inputs;
    want[c++] = f->mass + 2 * f->base + 4 * f->damping + 8 * bits + 256 * md->ae.degree + 4096 * f->friction + 8192 * md->own;
    want[c++] = md->ae.layers, want[c++] = f->mass_net.layers, want[c++] = f->layers, want[c++] = f->n;
    for (i = 0; i <= md->ae.layers; i++)
        want[c++] = md->ae.size[i];
    for (i = 1; i < f->mass_net.layers; i++)
        want[c++] = f->mass_net.size[i];
    for (i = 0; i <= f->layers; i++)
        want[c++] = f->n;
    for (i = 0; i < f->layers; i++)
        want[c++] = ROLN_GYRO;
    if (f->angles) want[c++] = (int)(f->angles & 65535), want[c++] = (int)(f->angles >> 16);
    CHECK(c == p->sizes);
    for (i = 0; i < c; i++)
        CHECK(p->bytes[8 + 2 * i] + 256 * p->bytes[9 + 2 * i] == want[i]);
    CHECK(memcmp(p->bytes + p->lead, &md->ae.slope, sizeof(roln_real)) == 0);
    CHECK(memcmp(p->bytes + p->lead + sizeof(roln_real), &f->least, sizeof(roln_real)) == 0);
}

/* Numbers of model k, own: with own units: a true autoencoder, otherwise any bits that may be unpacked. */
static void any_numbers(int k, int own, uint64_t *s, roln_real *x)
{
    const int n = n_OF(k), ae = roln_ae_params(&models[k].md->ae);
    roln_real *range = x + 6 + own, *theta = range + 3 * n;
    int i;
    x[0] = models[k].md->ae.slope, x[1] = models[k].md->lnn.least;
    x[2] = models[k].md->lnn.angles ? 1 : ROLN_C(0.3), x[3] = ROLN_C(0.7), x[4] = ROLN_C(1.7), range[-1] = dt;
    for (i = 0; i < own; i++)
        x[5 + i] = models[k].md->lnn.angles >> i & 1 ? 1 : ROLN_C(0.1) * (roln_real)(i + 1);
    random_bits(3 * n, s, range);
    for (i = 0; i < n; i++) { /* z_min <= z_max, zd_max >= 0 */
        roln_real *lo = range + i, *hi = lo + n, *top = hi + n;
        const roln_real a = *lo;
        if (*lo > *hi) *lo = *hi, *hi = a;
        *top = ROLN_ABS(*top);
    }
    CHECK_OK(roln_ae_init(&models[k].md->ae, theta, s, ROOM(init)));
    random_bits(models[k].params - ae, s, theta + ae);
}

/* own: of the same model, but with own units. */
static void test_pack(int k, int own)
{
    static package p;
    static roln_model md;
    const roln_real odd[3] = {(roln_real)NAN, -(roln_real)INFINITY, -ROLN_C(0.0)};
    const int units = own ? N_OF(k) : 0;
    uint64_t s = 90;
    int i, j;
    md = *models[k].md, md.own = own;
    package_of(&md, &p);
    CHECK(p.total == models[k].packed + units * (int)sizeof *p.x && p.numbers == 6 + units + 3 * p.n + models[k].params);
    any_numbers(k, units, &s, p.x);
    seal(&p);
    check_head(&p, 0);
    check_corruption(&p, 8, 401);
    for (i = 0; i <= p.total + 3; i++) { /* every length, in memory of that length */
        unsigned char *bytes;
        if (i == p.total) continue;
        bytes = (unsigned char *)malloc((size_t)i + 1);
        memset(bytes, 0, (size_t)i + 1);
        memcpy(bytes, p.bytes, (size_t)(i < p.total ? i : p.total));
        CHECK(roln_unpack(p.md, i, bytes, p.to) == ROLN_E_LENGTH);
        free(bytes);
    }
    CHECK(unpack(&p, -1) == ROLN_E_LENGTH && unpack(&p, -2147483647) == ROLN_E_LENGTH);
    for (i = 0; i < p.md->lnn.layers; i++) { /* ReEig, BiMap and other sizes than n, which there were before 0.4.0 */
        const int layers = p.md->lnn.layers, kind = 8 + 2 * (p.sizes - layers + i), size = kind - 2 * (layers + 1);
        for (j = 2; j <= 3; j++)
            p.bad[kind] = (unsigned char)j, CHECK(unpack(&p, p.total) == ROLN_E_SHAPE);
        p.bad[kind] = ROLN_GYRO, p.bad[size]++;
        CHECK(unpack(&p, p.total) == ROLN_E_SHAPE);
        p.bad[size]--;
    }
    for (i = 0; i < MODELS; i++) /* bytes of another model */
        if (i != k || own) {
            const roln_status st = roln_unpack(models[i].md, p.total, p.bytes, p.to);
            CHECK(st == ROLN_E_SHAPE || (st == ROLN_E_LENGTH && p.total < 8 + 2 * 40));
        }
    for (i = 0; i < p.numbers; i++) /* numbers, under a true checksum: other slope or least, bad scales, NaN */
        for (j = 0; j < 3; j++) {
            if (j == 2 && i > 4 + units) continue;
            CHECK(unpack_with(&p, i, odd[j]) == (i < 2 ? ROLN_E_SHAPE : ROLN_E_NOT_FINITE));
        }
    if (p.md->lnn.angles) CHECK(unpack_with(&p, 2, ROLN_C(0.5)) == ROLN_E_SHAPE); /* z of angles is q */
    for (i = 0; i < units; i++)
        if (p.md->lnn.angles >> i & 1) CHECK(unpack_with(&p, 5 + i, ROLN_C(0.5)) == ROLN_E_SHAPE);
    for (i = 0; i < units; i++)
        CHECK(unpack_with(&p, 5 + i, -1) == ROLN_E_NOT_FINITE);
    CHECK(all(MAXNUM, p.to, 7));
    CHECK(unpack(&p, p.total) == ROLN_OK && same(p.numbers, p.x, p.to) && all(MAXNUM - p.numbers, p.to + p.numbers, 7));
    CHECK(roln_fnv(6, (const unsigned char *)"foobar", ROLN_FNV) == UINT64_C(0x85944171f73967e8));
}

/* Files that are whole, but whose numbers make no sense. */
static void test_sealed(int k, int own)
{
    static package p;
    static roln_model md;
    const int n = n_OF(k), step = 5 + (own ? N_OF(k) : 0), low = step + 1, high = low + n, top = high + n, theta = top + n;
    uint64_t s = 91;
    int i, l, at = theta;
    md = *models[k].md, md.own = own;
    package_of(&md, &p);
    any_numbers(k, step - 5, &s, p.x);
    p.x[step] = 0; /* the step, in no training yet */
    for (i = 0; i < n; i++)
        p.x[low + i] = -1, p.x[high + i] = 1, p.x[top + i] = 0;
    seal(&p);
    CHECK(unpack(&p, p.total) == ROLN_OK);
    fill(MAXNUM, 7, p.to);
    CHECK(unpack_with(&p, step, -dt) == ROLN_E_RANGE);
    for (i = 0; i < n; i++) {
        CHECK(unpack_with(&p, low + i, 1 + ROLN_EPS) == ROLN_E_RANGE &&
              unpack_with(&p, high + i, -1 - 2 * ROLN_EPS) == ROLN_E_RANGE);
        CHECK(unpack_with(&p, top + i, -ROLN_EPS) == ROLN_E_RANGE);
        CHECK(unpack_with(&p, low + i, 1) == ROLN_OK); /* a range may be a point */
        fill(MAXNUM, 7, p.to);
    }
    for (l = 0; l < p.md->ae.layers; l++) { /* Psi^T Phi = I no longer, by any one number of Phi or Psi */
        const int N = p.md->ae.size[l], m = p.md->ae.size[l + 1];
        for (i = 0; i < 2 * N * m; i++) {
            const roln_real was = p.x[at + i];
            const roln_status st = unpack_with(&p, at + i, was + 1);
            /* in a square layer every number matters; else only where the other matrix sees it */
            CHECK(st == ROLN_E_ILL_CONDITIONED || (st == ROLN_OK && N > m));
            if (st == ROLN_OK) fill(MAXNUM, 7, p.to);
        }
        CHECK(unpack_with(&p, at, p.x[at] + 100) == ROLN_E_ILL_CONDITIONED);
        CHECK(unpack_with(&p, at + N * m, p.x[at + N * m] + 100) == ROLN_E_ILL_CONDITIONED);
        at += 2 * N * m;
        CHECK(unpack_with(&p, at, 5) == ROLN_OK); /* a bias is free */
        fill(MAXNUM, 7, p.to);
        at += N;
    }
}

/* ---- written parameters ----------------------------------------------------------------------- */

static char text[400000], whole[400000];
static void put(void *ctx, const char *piece)
{
    size_t *at = (size_t *)ctx, len = strlen(piece);
    CHECK(*at + len < sizeof text);
    memcpy(text + *at, piece, len + 1);
    *at += len;
}

/* One number at *p, as the compiler would read it: [-] digits '.' [f] { (* or /) digits '.' [f] } */
static int read_real(const char **p, roln_real *x)
{
    char *end, op = 0;
    for (*x = 0;; op = *(*p)++) {
        const int sign = op == 0 && **p == '-';
        roln_real v;
        if (sign) ++*p;
        if (**p < '0' || **p > '9') return 0;
        v = (roln_real)strtod(*p, &end);
        if (end[-1] != '.' || (sizeof *x == 4 && *end++ != 'f')) return 0;
        if (op == '*') *x *= v;
        else if (op == '/') *x /= v;
        else *x = sign ? -v : v;
        *p = end;
        if (**p != '*' && **p != '/') return 1;
    }
}

/* The numbers x [count] of md are written as they are. */
static void check_write(const roln_model *md, int count, const roln_real *x)
{
    static const char head[] = "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n";
    static const char tail[] = "}};\n#endif\n#endif\n";
    const char *at = text;
    roln_real y;
    size_t len = 0;
    int lists = 0, column = 0, i;
    CHECK(roln_write(md, "plain", x, put, &len) == ROLN_OK);
    at = strstr(text, head);
    CHECK(at != NULL && strcmp(text + len - strlen(tail), tail) == 0);
    if (!at) return;
    at += strlen(head);
    for (i = 0; i < count; i++) {
        const size_t gap = strspn(at, " ,{}\n");
        if (memchr(at, '{', gap) || memchr(at, '}', gap)) column = 0;
        else if (memchr(at, '\n', gap)) CHECK(column == 8), column = 0; /* eight a line */
        CHECK(column++ < 8);
        at += gap;
        CHECK(read_real(&at, &y) && same(1, &y, x + i));
    }
    CHECK(strcmp(at, tail) == 0);
    for (at = text, i = 0; *at; at++)
        i += (*at == '{') - (*at == '}'), lists += *at == '{';
    CHECK(i == 0 && lists == 6 + md->own);
    CHECK(strstr(text, md->own ? "plain_weights_are_of_ROLN_SCALE_each[plain_own == 1 ?"
                               : "plain_weights_are_of_ROLN_SCALE_common[plain_own == 0 ?") != NULL);
}

static void test_write(void)
{
    static const roln_real edge[8] = {0,
                                      PICK(1e-45f, 4.9406564584124654e-324),
                                      PICK(3.4028235e38f, 1.7976931348623157e308),
                                      PICK(1.17549435e-38f, 2.2250738585072014e-308),
                                      PICK(1.1754942e-38f, 2.225073858507201e-308),
                                      1,
                                      PICK(16777216, 9007199254740992.0),
                                      ROLN_C(0.1)};
    enum { NUMBERS = 6 + 6 + plain_theta_size };
    static plain_params p;
    roln_model own = plain_model;
    roln_real x[NUMBERS + plain_N];
    uint64_t s = 95;
    size_t len = 0;
    int i;
    own.own = 1;
    random_bits(NUMBERS + plain_N, &s, x);
    for (i = 0; i < 16; i++)
        x[2 + i] = i % 2 ? -edge[i / 2] : edge[i / 2];
    for (i = 0; i < 2; i++) { /* of another config: nothing is written */
        x[i] = i ? plain_model.ae.slope * (1 + ROLN_EPS) : 0, x[1] = plain_model.lnn.least;
        memcpy(&p, x, sizeof p);
        CHECK(plain_write(&p, put, &len) == ROLN_E_SHAPE && len == 0);
    }
    x[0] = plain_model.ae.slope;
    CHECK(sizeof p == NUMBERS * sizeof *x);
    check_write(&plain_model, NUMBERS, x), check_write(&own, NUMBERS + plain_N, x);
    memcpy(&p, x, sizeof p);
    roln_write(&plain_model, "plain", &p, put, &len), memcpy(whole, text, len + 1);
    CHECK(strstr(text, "*1152921504606846976") != NULL); /* powers of two in steps of 2^60 */
    len = 0;
    CHECK(plain_write(&p, put, &len) == ROLN_OK && strcmp(text, whole) == 0);
    x[6] = (roln_real)NAN, len = 0;
    CHECK(roln_write(&own, "plain", x, put, &len) == ROLN_E_NOT_FINITE && len == 0);
}

/* What the text demands of a config: enumerators with the values that they have where the model is defined, in 15 types whose names
   are the compiler's complaints. */
#define ENUMERATORS(X, of) \
    X(of, N) X(of, N1) X(of, N2) X(of, N3) X(of, N4) X(of, N5) X(of, N6) X(of, N7) X(of, N8) X(of, H1) X(of, H2) X(of, H3) \
    X(of, H4) X(of, H5) X(of, scheme) X(of, degree) X(of, cholesky) X(of, base) X(of, L0) X(of, L1) X(of, L2) X(of, L3) \
    X(of, damping) X(of, friction) X(of, angles) X(of, own) X(of, inputs) X(of, stored) X(of, twice) X(of, format)
#define ENUMERATOR(of, name) {#of "_" #name, of##_##name},
#define OWN_WORDS PICK("DOUBLE_not_defined_0", "DOUBLE_defined_1"), "FORMAT_3"
enum { NEEDS = 15, NEEDED = 30 };
typedef struct {
    const char *name;
    int value;
} enumerator;

static void check_needs(const roln_model *md, const char *name, const enumerator *is, const char *const *words)
{
    char want[400];
    const char *at = text;
    size_t len = 0;
    const rolni_text to = {name, put, &len};
    int need, i = 0;
    rolni_write_needs(&to, md);
    for (need = 0; need < NEEDS; need++) {
        int more = 0;
        snprintf(want, sizeof want, "typedef char %s_weights_are_of_ROLN_%s[", name, words[need]);
        CHECK(strncmp(at, want, strlen(want)) == 0);
        for (at += strlen(want); i < NEEDED; i++, more = 1) {
            snprintf(want, sizeof want, "%s%s == %d", more ? " && " : "", is[i].name, is[i].value);
            if (strncmp(at, want, strlen(want)) != 0) break;
            at += strlen(want);
        }
        if (!CHECK(more && strncmp(at, " ? 1 : -1];\n", 12) == 0)) return;
        at += 12;
    }
    CHECK(i == NEEDED && *at == 0);
}

static void test_needs(void)
{
#define NEEDS_OF(of, ...) \
    { \
        static const enumerator is[NEEDED] = {ENUMERATORS(ENUMERATOR, of)}; \
        static const char *const words[NEEDS] = {__VA_ARGS__, OWN_WORDS}; \
        check_needs(&of##_model, #of, is, words); \
    }
    NEEDS_OF(plain, "AE_6_4_2", "MLP_5_4", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0", "DAMPING_0",
             "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "STORE_full")
    NEEDS_OF(deep, "AE_10_9_8_7_6_5_4_3_2", "MLP_3_2_3_2_3", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0",
             "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "STORE_full")
    NEEDS_OF(rich, "AE_6_5_3", "MLP_4_3", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_1", "LAYERS_gyro",
             "DAMPING_1", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_2", "STORE_full")
    NEEDS_OF(layered, "AE_2", "MLP_3", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_gyro_gyro_gyro_gyro",
             "DAMPING_1", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "STORE_full")
    NEEDS_OF(delan, "AE_4_2", "MLP_4", "STEP_euler", "CHART_none_0", "MASS_cholesky", "BASE_0", "LAYERS_0", "DAMPING_0",
             "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "STORE_full")
    NEEDS_OF(curved, "AE_6_4_3", "MLP_4_3", "STEP_midpoint", "CHART_polynomial_2", "MASS_exponential", "BASE_0", "LAYERS_0",
             "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_2", "STORE_full")
    NEEDS_OF(wheel, "AE_3", "MLP_4_5", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0", "DAMPING_1",
             "FRICTION_1", "ANGLES_1_0_1_bits_5", "SCALE_common", "INPUTS_0", "STORE_full")
#ifndef ROLN_DOUBLE
    NEEDS_OF(stored, "AE_6_4_2", "MLP_5_4", "STEP_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0",
             "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "STORE_int8")
#endif
#undef NEEDS_OF
}

/* ---- some of the joints, stored weights ------------------------------------------------------- */

/* What is asked for of decode, bit for bit; what is asked wrongly is refused. */
static void test_some(int k)
{
    static roln_real theta[MAXP];
    const roln_trained m = trained(models[k].md, scale_of(k), theta);
    const int N = N_OF(k), n = n_OF(k);
    const struct {
        int count, which;
        roln_status want;
    } wrong[5] = {{-1, 0, ROLN_E_LENGTH},
                  {N + 1, 0, ROLN_E_LENGTH},
                  {1, -1, ROLN_E_LENGTH},
                  {1, N, ROLN_E_LENGTH},
                  {1, 0, ROLN_E_NOT_FINITE}}; /* the last with NaN in z */
    roln_real z[MAXN], zd[MAXN], q[MAXN], qd[MAXN], some[MAXN], somed[MAXN];
    uint64_t s = 130 + (uint64_t)k;
    int which[MAXN], count, i;
    parameters(k, &s, theta), dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd);
    CHECK_OK(roln_decode(&m, z, zd, q, qd, ROOM(decode)));
    for (count = 0; count <= N; count++) {
        for (i = 0; i < MAXN; i++)
            which[i] = i < count ? roln_randint(N, &s) : -1;
        fill(MAXN, 7, some), fill(MAXN, 7, somed);
        CHECK_OK(roln_decode_some(&m, z, zd, count, which, some, somed, ROOM(decode_some)));
        ROOM_KEPT();
        for (i = 0; i < count; i++)
            CHECK(same(1, some + i, q + which[i]) && same(1, somed + i, qd + which[i]));
        CHECK(all(MAXN - count, some + count, 7) && all(MAXN - count, somed + count, 7));
    }
    fill(MAXN, 7, some), fill(MAXN, 7, somed);
    for (i = 0; i < 5; i++) {
        which[0] = wrong[i].which;
        if (i == 4) z[0] = (roln_real)NAN;
        CHECK(roln_decode_some(&m, z, zd, wrong[i].count, which, some, somed, ROOM(decode_some)) == wrong[i].want);
        CHECK(all(MAXN, some, 7) && all(MAXN, somed, 7));
    }
}

#ifndef ROLN_DOUBLE
static roln_status store(int k, const roln_model *md, const roln_trained *from, float *theta)
{
    roln_status st;
    sizes z = models[k].size;
    z.ae_size = roln_ae_params(&md->ae);
    st = roln_store(md, from, theta, room_of(ROLN_AE_STORE_WORK(OF_Z)));
    ROOM_KEPT();
    return st;
}

/* Nothing trains stored weights: gradients are refused, and written nowhere. */
static void check_not_trained(int k, const roln_trained *m)
{
    static data d;
    static float g[MAXP];
    float windows = 0;
    uint64_t s = 145;
    terms t;
    const roln_gradient to = roln_gradient_of(models[k].md, g, &t.loss, &windows);
    int kind;
    fill(MAXP, 7, g), fill(TERMS, 7, t.term);
    for (kind = 0; kind < KINDS; kind++) {
        make(k, kind, 2, &s, &d);
        CHECK(add_grad(k, m, &weights.loss, &d, 2, &to) == ROLN_E_SHAPE);
    }
    CHECK(all(MAXP, g, 7) && all(TERMS, t.term, 7) && all(1, &windows, 0));
}

/* Words among the weights may look like NaN, infinity, anything; they are written as they are. A number may not. */
static void check_written(const roln_model *md, package *p)
{
    static const char head[] = "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n    {{\n";
    static const char tail[] = "\n}};\n#endif\n#define mx_weights mx_flash.params\n#endif\n";
    float *theta = p->x + 6 + 3 * p->n;
    const char *at;
    size_t len = 0;
    int i, nan = 0, number = -1;
    for (i = 0; i < roln_params(md); i++) {
        const uint32_t words[4] = {UINT32_C(0xffffffff), UINT32_C(0x7f800001), UINT32_C(0xff800000) + (uint32_t)i, 0xff800000};
        if (roln_ae_is_number(&md->ae, i)) number = number < 0 ? i : number;
        else memcpy(theta + i, words + i % 4, sizeof *words), nan++;
    }
    CHECK(nan > 0 && number >= 0);
    CHECK_OK(roln_write(md, "mx", p->x, put, &len));
    at = strstr(text, head);
    CHECK(at != NULL && strcmp(text + len - strlen(tail), tail) == 0);
    if (!at) return;
    at += strlen(head) - 1;
    for (i = 0; i < p->numbers; i++) { /* all numbers, in the order of NAME_params */
        uint32_t want;
        char *end = NULL;
        memcpy(&want, p->x + i, sizeof want);
        at += strspn(at, " \n");
        CHECK(at[0] == '0' && at[1] == 'x' && strtoul(at, &end, 16) == want && *end == ',' && end == at + 10);
        at = end + 1;
    }
    CHECK(*at == '\n' && at[1] == '}');
    len = 0, theta[number] = INFINITY;
    CHECK(roln_write(md, "mx", p->x, put, &len) == ROLN_E_NOT_FINITE && len == 0);
}

/* One of the small models with its weights stored: packed, every byte of it, unpacked, written. */
static void test_stored(int k, const roln_storage *storage)
{
    static package p;
    static float theta[MAXP];
    roln_model md = *models[k].md;
    const int n = n_OF(k), all_params = models[k].params, nets = all_params - roln_ae_params(&models[k].md->ae);
    float *range = p.x + 6, *weights_of = range + 3 * n;
    const roln_trained from = {models[k].md, &scale, range, range + n, range + 2 * n, theta, NULL};
    const roln_trained m = {&md, &scale, range, range + n, range + 2 * n, weights_of, NULL};
    uint64_t s = 140 + (uint64_t)k;
    int params, i;
    md.ae.storage = storage, params = roln_params(&md);
    package_of(&md, &p);
    parameters(k, &s, theta);
    p.x[0] = md.ae.slope, p.x[1] = md.lnn.least, p.x[2] = 0.3f, p.x[3] = 0.7f, p.x[4] = 1.7f, p.x[5] = dt;
    for (i = 0; i < 3 * n; i++)
        range[i] = i < n ? -1 : 1;
    theta[all_params - 1] = NAN; /* of the networks */
    fill(MAXP, 7, weights_of);
    CHECK(store(k, &md, &from, weights_of) == ROLN_E_NOT_FINITE && all(params, weights_of, 7));
    theta[all_params - 1] = 0.25f;
    CHECK_OK(store(k, &md, &from, weights_of));
    check_not_trained(k, &m);
    CHECK(same(nets, weights_of + params - nets, theta + all_params - nets));
    seal(&p);
    check_head(&p, storage->bits);
    check_corruption(&p, 0, 101);
    for (i = 0; i < params; i++) { /* NaN under a true checksum: refused among numbers; among words it is a matter of Psi^T Phi */
        const roln_status st = unpack_with(&p, 6 + 3 * n + i, NAN);
        if (roln_ae_is_number(&md.ae, i)) CHECK(st == ROLN_E_NOT_FINITE);
        else CHECK(st == ROLN_OK || st == ROLN_E_ILL_CONDITIONED || (st == ROLN_E_NOT_FINITE && storage->bits == 16));
        if (st == ROLN_OK) fill(MAXNUM, 7, p.to);
    }
    CHECK(roln_unpack(models[k].md, p.total, p.bytes, p.to) == ROLN_E_SHAPE && all(MAXNUM, p.to, 7));
    CHECK(unpack(&p, p.total) == ROLN_OK && same(p.numbers, p.to, p.x));
    check_written(&md, &p);
}

/* Linearisation of a step under torques against differences. */
static void check_stored_linear(const stored_params *p, const stored_latent *s, const float *tau)
{
    static stored_linwork lin;
    static stored_work work;
    const float h = 1.f / 64;
    stored_jacobian jac;
    stored_latent u = *s;
    float moved[6], up[4], down[4];
    int i, j;
    CHECK_OK(stored_linear(p, &u, tau, dt, &jac, &lin));
    for (j = 0; j < 6; j++) {
        memcpy(moved, tau, sizeof moved);
        moved[j] = tau[j] + h, u = *s;
        CHECK_OK(stored_step(p, &u, moved, dt, &work));
        memcpy(up, &u, sizeof up);
        moved[j] = tau[j] - h, u = *s;
        CHECK_OK(stored_step(p, &u, moved, dt, &work));
        memcpy(down, &u, sizeof down);
        for (i = 0; i < 4; i++)
            CHECK_NEAR(jac.B[6 * i + j], (up[i] - down[i]) / (2 * h), 2e-4);
    }
}

/* Stored parameters encode, decode, step as the full ones do, nearly. */
static void check_stored_motion(const plain_params *p, const stored_params *a, const float *q, const float *qd)
{
    static const int which[3] = {5, 0, 2};
    static plain_work work;
    static stored_work stored;
    plain_state x;
    stored_state y;
    plain_latent s;
    stored_latent t, u;
    float some[3], somed[3];
    int i;
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd), memcpy(&y, &x, sizeof y);
    CHECK_OK(plain_encode(p, &x, &s, &work));
    CHECK_OK(stored_encode(a, &y, &t, &stored));
    for (i = 0; i < 2; i++)
        CHECK_NEAR(t.z[i], s.z[i], 0.02), CHECK_NEAR(t.zd[i], s.zd[i], 0.04);
    CHECK_OK(plain_decode(p, &s, &x, &work));
    CHECK_OK(stored_decode(a, &t, &y, &stored));
    for (i = 0; i < 6; i++)
        CHECK_NEAR(y.q[i], x.q[i], 0.03), CHECK_NEAR(y.qd[i], x.qd[i], 0.06);
    CHECK_OK(stored_encode(a, &y, &u, &stored));
    for (i = 0; i < 2; i++)
        CHECK_NEAR(u.z[i], t.z[i], 1e-3), CHECK_NEAR(u.zd[i], t.zd[i], 1e-3);
    CHECK_OK(stored_decode_some(a, &t, 3, which, some, somed, &stored));
    for (i = 0; i < 3; i++)
        CHECK(same(1, some + i, y.q + which[i]) && same(1, somed + i, y.qd + which[i]));
    check_stored_linear(a, &t, q);
}

/* The typed way: bytes of the full model, stored. */
static void test_stored_shell(void)
{
    static plain_params p;
    static stored_params a, b;
    static stored_words words;
    static plain_start init;
    static plain_work work;
    static unsigned char full[plain_packed_size], bytes[stored_packed_size];
    stored_start *start = (stored_start *)(void *)room_of((int)(sizeof *start / sizeof(float)));
    float q[24], qd[24];
    uint64_t seed = 11;
    CHECK_OK(plain_init(&p, &seed, &init));
    dyadic(24, 1, &seed, q), dyadic(24, 1, &seed, qd);
    plain_pack(&p, full);
    memset(&b, 7, sizeof b), a = b;
    CHECK(stored_store(plain_packed_size, full, &a, start) == ROLN_E_RANGE && memcmp(&a, &b, sizeof a) == 0); /* no range yet */
    CHECK_OK(plain_fit_range(&p, 4, q, qd, &work));
    p.dt = dt;
    plain_pack(&p, full);
    CHECK(stored_store(plain_packed_size - 1, full, &a, start) == ROLN_E_LENGTH);
    full[300] ^= 1;
    CHECK(stored_store(plain_packed_size, full, &a, start) == ROLN_E_CHECKSUM && memcmp(&a, &b, sizeof a) == 0);
    full[300] ^= 1;
    CHECK_OK(stored_store(plain_packed_size, full, &a, start));
    CHECK_ROOM();
    CHECK((int)stored_packed_size < (int)plain_packed_size);
    CHECK(memcmp(&a.scale, &p.scale, sizeof a.scale) == 0 && same(1, &a.dt, &p.dt) && a.slope == p.slope && a.least == p.least);
    CHECK(same(2, a.z_min, p.z_min) && same(2, a.z_max, p.z_max) && same(2, a.zd_max, p.zd_max));
    stored_pack(&a, bytes);
    CHECK(stored_unpack(stored_packed_size, bytes, &b) == ROLN_OK && memcmp(&a, &b, sizeof a) == 0);
    CHECK(stored_store(stored_packed_size, bytes, &b, start) != ROLN_OK && memcmp(&a, &b, sizeof a) == 0); /* stored already */
    CHECK(sizeof words == sizeof a && stored_theta_size == roln_params(&stored_model));
    CHECK((int)stored_full_size == (int)plain_theta_size);
    words.params = a; /* as flash holds it */
    check_stored_motion(&p, &words.params, q, qd);
}
#endif

/* ---- data, sizes, training -------------------------------------------------------------------- */

/* On both sides of pi angles are as near to each other as anywhere: scales, range, variance and roll-out errors of a slow motion
   that was recorded with jumps by a turn are those of the same motion recorded without. */
static void test_seam(void)
{
    enum { SAMPLES = 12, N = wheel_N };
    static wheel_params p, of;
    static wheel_start start;
    static wheel_train train;
    static wheel_work work;
    const ld turn = 8 * atanl(1);
    roln_real q[2][SAMPLES * N], qd[SAMPLES * N], bar[2][N];
    roln_loss var[2] = {{0}};
    roln_error e[2][2];
    roln_batch b = {.count = SAMPLES - 1, .steps = 1, .stride = 1, .qd = qd};
    int first[SAMPLES], k, i, jumps = 0;
    uint64_t s = 5;
    for (k = 0; k < SAMPLES; k++)
        for (first[k] = k, i = 0; i < N; i++) {
            const ld at = turn / 2 + 0.0625L * (k - 5) * (i + 1);
            q[0][k * N + i] = (roln_real)at, q[1][k * N + i] = (roln_real)(i == 1 ? at : remainderl(at, turn));
            qd[k * N + i] = ROLN_C(0.0625) * (roln_real)(i + 1) / dt * (1 + ROLN_C(0.0009765625) * (roln_real)(k % 2)); /* varies */
            jumps += q[1][k * N + i] < 0;
        }
    CHECK(jumps > 8);
    b.start = first;
    for (k = 0; k < 2; k++) {
        b.q = q[k], b.count = SAMPLES - 1, b.steps = 1;
        CHECK_OK(wheel_init_pod(&p, SAMPLES, q[k], qd, bar[k], &s, &start));
        CHECK(all(1, &p.scale.q, 1) && p.scale.t > 0);
        if (k == 0) of = p; /* networks of one seed */
        CHECK(all(1, &p.scale.t, of.scale.t));
        CHECK_OK(wheel_fit_range(&p, SAMPLES, q[k], qd, &work));
        for (i = 0; i < N; i++) {
            if (i != 1) CHECK_NEAR(roln_wrap(bar[k][i] - bar[0][i]), 0, 40 * EPS);
            if (i != 1) CHECK_NEAR(p.z_max[i], turn / 2, 4 * EPS);
            if (i != 1) CHECK_NEAR(p.z_min[i], -turn / 2, 4 * EPS);
        }
        CHECK_NEAR(p.z_max[1], (ld)q[0][(SAMPLES - 1) * N + 1], EPS);
        CHECK_OK(wheel_variance(&of, &b, &var[k], &train));
        CHECK_OK(wheel_errors(&of, &b, dt, 1, bar[k], e[k], NULL, &train));
        CHECK_BELOW(var[k].q, 3);
        CHECK_NEAR(var[k].q, var[0].q, 200 * EPS * (ld)var[0].q);
        for (i = 0; i < 2; i++) {
            CHECK_NEAR(e[k][i].q_var, e[0][i].q_var, 400 * EPS * (ld)e[0][i].q_var);
            CHECK_NEAR(e[k][i].q, e[0][i].q, 400 * EPS * ((ld)e[0][i].q + 1));
        }
        CHECK_BELOW(e[k][1].q, 3);
    }
    CHECK(!wheel_foreign(&of));
    of.scale.q = ROLN_C(0.5); /* no turn of q is one of z */
    CHECK(wheel_foreign(&of) && wheel_errors(&of, &b, dt, 1, bar[0], e[0], NULL, &train) == ROLN_E_SHAPE);
}

static void test_shuffle(void)
{
    int index[100], again[100], seen[100] = {0}, orders[6] = {0}, one = 5, i;
    uint64_t s = 1, r = 1;
    for (i = 0; i < 100; i++)
        index[i] = again[i] = i;
    roln_shuffle(100, index, &s), roln_shuffle(100, again, &r);
    CHECK(memcmp(index, again, sizeof index) == 0 && s == r);
    for (i = 0; i < 100; i++)
        seen[index[i]]++;
    for (i = 0; i < 100; i++)
        CHECK(seen[i] == 1);
    for (i = 0; i < 6000; i++) { /* every order of three equally often */
        int t[3] = {0, 1, 2};
        roln_shuffle(3, t, &s);
        orders[2 * t[0] + (t[1] > t[2])]++;
    }
    for (i = 0; i < 6; i++)
        CHECK_NEAR(orders[i], 1000, 150);
    roln_shuffle(0, &one, &s), roln_shuffle(1, &one, &s);
    CHECK(one == 5);
}

/* Scales and range of ten samples. */
static void test_fit(void)
{
    enum { SAMPLES = 10, N = plain_N };
    static roln_real theta[MAXP];
    const roln_trained m = trained(&plain_model, &unit, theta);
    roln_real q[SAMPLES * N], qd[SAMPLES * N], still[SAMPLES * N] = {0}, bar[N], lo[2], hi[2], top[2];
    roln_real *work = room_of(models[PLAIN].scratch.fit_range);
    roln_scale sc = {7, 7, 7};
    ld mean[N] = {0}, q2 = 0, qd2 = 0;
    int at_lo = 0, at_hi = 0, at_top = 0, i, j;
    uint64_t s = 1;
    dyadic(SAMPLES * N, 3, &s, q), dyadic(SAMPLES * N, 5, &s, qd);
    CHECK_OK(roln_fit_scale(&plain_model, SAMPLES, q, qd, bar, &sc, NULL));
    for (i = 0; i < SAMPLES * N; i++)
        mean[i % N] += (ld)q[i] / SAMPLES;
    for (i = 0; i < SAMPLES * N; i++) {
        q2 += ((ld)q[i] - mean[i % N]) * ((ld)q[i] - mean[i % N]) / SAMPLES;
        qd2 += (ld)qd[i] * (ld)qd[i] / SAMPLES;
    }
    for (i = 0; i < N; i++)
        CHECK_NEAR(bar[i], mean[i], 20 * EPS);
    CHECK_NEAR(sc.q, sqrtl(q2 / 2), 20 * EPS * (ld)sc.q);
    CHECK_NEAR(sc.t, sqrtl(q2 / qd2), 20 * EPS);
    sc.q = sc.t = 7;
    CHECK(roln_fit_scale(&plain_model, SAMPLES, q, still, bar, &sc, NULL) == ROLN_E_NOT_FINITE);
    CHECK(all(1, &sc.q, 7) && all(1, &sc.t, 7));
    CHECK(roln_fit_scale(&plain_model, 0, q, qd, bar, &sc, NULL) == ROLN_E_LENGTH && all(1, &sc.q, 7) && all(1, &sc.t, 7));

    parameters(PLAIN, &s, theta);
    CHECK_OK(roln_fit_range(&m, SAMPLES, q, qd, lo, hi, top, work));
    for (i = 0; i < SAMPLES; i++) {
        roln_real z[2], zd[2];
        CHECK_OK(roln_encode(&m, q + N * i, qd + N * i, NULL, z, zd, NULL, work));
        for (j = 0; j < 2; j++) {
            CHECK(z[j] >= lo[j] && z[j] <= hi[j] && ROLN_ABS(zd[j]) <= top[j]);
            at_lo += z[j] <= lo[j], at_hi += z[j] >= hi[j], at_top += ROLN_ABS(zd[j]) >= top[j];
        }
    }
    CHECK(at_lo == 2 && at_hi == 2 && at_top == 2);
    CHECK(roln_fit_range(&m, 0, q, qd, lo, hi, top, work) == ROLN_E_LENGTH);
}

/* The sizes of the shell, known to the compiler, are those that the functions find at run time. */
static void test_sizes(int k)
{
    const model *mo = models + k;
    const roln_model *md = mo->md;
    const roln_lnn *f = &md->lnn;
    const roln_mlp *net = &f->mass_net;
    const sizes z = mo->size;
    int numbers = 0, moments = 0, i, nb, dirs, keep;
    for (i = 0; i < mo->blocks; i++)
        numbers += roln_block_size(mo->table + i), moments += roln_block_moments(mo->table + i);
    CHECK(numbers == mo->params && moments == mo->moments && mo->params == roln_params(md));
    CHECK(z.N == md->ae.size[0] && z.N1 == roln_ae_size(&md->ae, 1) && z.N2 == roln_ae_size(&md->ae, 2));
    CHECK(z.n == f->n && z.n == md->ae.size[md->ae.layers]);
    CHECK(z.ae_sum == roln_ae_sum(&md->ae) && z.ae_size == roln_ae_params(&md->ae));
    CHECK(z.curves == md->ae.curves && z.bent == roln_ae_bent(&md->ae) && (z.curves > 0) == (md->ae.degree > 0));
    CHECK(z.inputs == md->inputs && z.force_size == roln_force_size(md) && z.scheme == md->scheme);
    CHECK(z.layers == f->layers && z.base == f->base && z.damping == f->damping && z.formed == rolni_formed(f));
    CHECK(z.cossin == rolni_cossin(f));
    CHECK(z.hidden == roln_mlp_hidden(net) && z.wide == roln_mlp_widest(net, 0) + roln_mlp_widest(net, 1));
    CHECK(ROLNI_CHAIN(OF_Z, 0) == rolni_chain_size(f, 0) && ROLNI_CHAIN(OF_Z, 2) == rolni_chain_size(f, 2));
    for (nb = 1; nb < 4; nb++) {
        for (dirs = 1; dirs <= 2; dirs++)
            for (keep = 0; keep < 2; keep++)
                CHECK(ROLN_LNN_TAPE(OF_Z, dirs, keep, nb) == roln_lnn_tape(f, dirs, keep, nb));
        for (i = 0; i <= 2; i++)
            CHECK(ROLNI_FORCE_WORK(OF_Z, nb, i) == rolni_torque_work(md, nb, i));
    }
    CHECK_NEAR(roln_update_work(mo->blocks, mo->table), mo->scratch.update, k == POLE || k == WHEEL ? 1 : 0);
    CHECK(grad_work(k, mo->block, mo->horizon) == mo->scratch.grad && grad_acc_work(k, mo->block) == mo->scratch.grad_acc);
    CHECK(errors_work(k, mo->block) == mo->scratch.errors);
}

static void test_shapes(void)
{
    CHECK(plain_N == 6 && plain_n == 2 && plain_ae_layers == 2);
    CHECK(bare_N == 3 && bare_n == 3 && bare_ae_layers == 0);
    CHECK(deep_n == 2 && deep_ae_layers == 8 && deep_mlp_layers == 6 && pole_n == 1);
    CHECK(sizeof(plain_params) == sizeof(roln_real) * (6 + 6 + plain_theta_size));
    CHECK(plain_model.scheme == ROLN_RK4 && bare_model.scheme == ROLN_MIDPOINT && square_model.scheme == ROLN_EULER);
}

/* What others keep in files and logs: the numbers of a status do not change. */
static void test_statuses(void)
{
    CHECK(ROLN_OK == 0 && ROLN_E_NOT_FINITE == -1 && ROLN_E_NOT_SPD == -2 && ROLN_E_NO_CONVERGENCE == -3);
    CHECK(ROLN_E_ILL_CONDITIONED == -4 && ROLN_E_RANGE == -5 && ROLN_E_LENGTH == -6 && ROLN_E_FORMAT == -7);
    CHECK(ROLN_E_PRECISION == -8 && ROLN_E_SHAPE == -9 && ROLN_E_CHECKSUM == -10);
}

/* The parameters are on their manifolds: Psi^T Phi = I; P and the biases of gyro layers are SPD. */
static void check_manifolds(int k, const roln_real *theta)
{
    const roln_model *md = models[k].md;
    const roln_lnn *f = &md->lnn;
    roln_real L[64];
    int l, i, j, p, at = 0;
    for (l = 0; l < md->ae.layers; l++) { /* Phi^T, Psi^T [n][N] each */
        const int N = md->ae.size[l], n = md->ae.size[l + 1];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                ld sum = -(ld)(i == j);
                for (p = 0; p < N; p++)
                    sum += (ld)theta[at + i * N + p] * (ld)theta[at + n * N + j * N + p];
                BOUND("constraint, eps", fabsl(sum) / EPS, 20);
            }
        at += 2 * n * N + N;
    }
    for (l = -1; l < f->layers; l++) {
        const int base = l < 0, w = f->n;
        const roln_real *X = theta + at + (base ? rolni_base_at(f) : rolni_layer_at(f, l) + ROLN_TRI(w));
        if (base && !f->base) continue;
        CHECK_OK(roln_chol(w, X, L));
        for (i = 0; i < w * w; i++)
            CHECK(same(1, X + i, X + i % w * w + i / w));
    }
}

static const roln_opt adam_options = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};

/* Updates from real gradients keep every model on its manifolds and change every block of it; a refused one changes nothing. */
static void test_update(int k)
{
    static data d;
    static roln_real theta[MAXP], first[MAXP], was[MAXP], g[MAXP], m[MAXP], v[MAXP], v_max[MAXP];
    const roln_model *md = models[k].md;
    const roln_trained mo = trained(md, &scale, theta);
    const roln_moments moments = {m, v, v_max};
    const int params = models[k].params, input_at = params - N_OF(k) * md->inputs;
    roln_adam adam, adam_was;
    uint64_t s = 100 + (uint64_t)k;
    terms t;
    int round, i, at = 0;
    memset(&adam, 0, sizeof adam), fill(MAXP, 0, m), fill(MAXP, 0, v), fill(MAXP, 0, v_max);
    CHECK_OK(roln_ae_init(&md->ae, theta, &s, ROOM(init)));
    roln_lnn_init(&md->lnn, theta + roln_ae_params(&md->ae), &s);
    dyadic(N_OF(k) * md->inputs, 1, &s, theta + input_at);
    memcpy(first, theta, sizeof theta);
    for (round = 0; round < 6; round++) {
        const int refused = round == 3;
        roln_status st;
        make(k, round % 2 ? ODE : ACC, 4, &s, &d);
        d.h = dt / 8;
        CHECK_OK(grad_of(k, &mo, &d, 16, g, &t));
        memcpy(was, theta, sizeof was), adam_was = adam;
        if (refused) g[params - 1] = (roln_real)NAN;
        st = roln_adam_update(models[k].blocks, models[k].table, &adam_options, 1 / (roln_real)4, g, theta, &adam, &moments,
                              ROOM(update));
        ROOM_KEPT();
        CHECK(st == (refused ? ROLN_E_NOT_FINITE : ROLN_OK));
        if (refused) CHECK(same(params, was, theta) && memcmp(&adam, &adam_was, sizeof adam) == 0);
    }
    check_manifolds(k, theta);
    for (i = 0; i < models[k].blocks; i++) {
        const int size = roln_block_size(models[k].table + i);
        CHECK(size == 0 || !same(size, theta + at, first + at));
        at += size;
    }
}

/* ---- arguments that make no sense ------------------------------------------------------------- */

/* Settings of an update that make no sense: a status, and nothing moves. */
static void test_settings(void)
{
    static plain_params p, p0;
    static plain_optimiser o, o0;
    static plain_gradient g;
    static plain_train train;
    static plain_start start;
    uint64_t seed = 15;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start));
    g.windows = 1, p0 = p, o0 = o;
    for (i = 0; i < 6; i++) {
        roln_opt opt = ROLN_OPT(ROLN_C(0.01), ROLN_C(0.01));
        if (i < 3) opt.lr[i] = i == 1 ? -1 : (roln_real)NAN;
        if (i == 3) opt.clip = (roln_real)NAN;
        if (i == 4) opt.decay = (roln_real)INFINITY;
        if (i == 5) opt.lr[0] = (roln_real)INFINITY;
        CHECK(plain_update(&p, &opt, &o, &g, &train) == ROLN_E_NOT_FINITE);
        CHECK(memcmp(&p, &p0, sizeof p) == 0 && memcmp(&o, &o0, sizeof o) == 0);
    }
}

/* A status each, and nothing is written. */
static void test_arguments(void)
{
    static const struct {
        int count, steps, stride;
    } wrong[5] = {{2, -40, 1}, {2, -1, 1}, {2, 1, 0}, {2, 1, -3}, {-1, 1, 1}};
    static plain_params p;
    static plain_train train;
    static plain_start start;
    static plain_work work;
    static plain_gradient g;
    static data d;
    uint64_t seed = 14;
    roln_error e[2 * MAXE], sevens = {7, 7, 7, 7};
    roln_real u[4], tau_z[2] = {1, 1}, *numbers = (roln_real *)(void *)&g;
    plain_latent s = {{0, 0}, {0, 0}};
    terms var;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start));
    make(PLAIN, ODE, 2, &seed, &d), d.b.qdd = d.qdd;
    fill(plain_theta_size + TERMS + 1, 7, numbers), fill(TERMS, 7, var.term), fill(4, 7, u);
    for (i = 0; i < 2 * MAXE; i++)
        e[i] = sevens;
    p.slope /= 2; /* numbers of another config */
    CHECK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train) == ROLN_E_SHAPE);
    CHECK(plain_grad_acc(&p, &acc_weights, &d.b, &g, &train) == ROLN_E_SHAPE);
    CHECK(plain_variance(&p, &d.b, &var.loss, &train) == ROLN_E_SHAPE && plain_fit_inertia(&p, &d.b, &train) == ROLN_E_SHAPE);
    CHECK(plain_errors(&p, &d.b, dt, 1, d.q, e, e + MAXE, &train) == ROLN_E_SHAPE);
    p.slope *= 2;
    for (i = 0; i < 5; i++) {
        roln_batch b = d.b;
        b.count = wrong[i].count, b.steps = wrong[i].steps, b.stride = wrong[i].stride;
        CHECK(plain_grad(&p, &ode_weights, &b, dt, &g, &train) == ROLN_E_LENGTH);
        CHECK(plain_grad_acc(&p, &acc_weights, &b, &g, &train) == ROLN_E_LENGTH);
        CHECK(plain_variance(&p, &b, &var.loss, &train) == ROLN_E_LENGTH && plain_fit_inertia(&p, &b, &train) == ROLN_E_LENGTH);
        CHECK(plain_errors(&p, &b, dt, 1, d.q, e, e + MAXE, &train) == ROLN_E_LENGTH);
        b.qd = NULL;
        CHECK(plain_grad(&p, &ode_weights, &b, dt, &g, &train) == ROLN_E_LENGTH);
    }
    for (i = 0; i > -3; i--)
        CHECK(plain_errors(&p, &d.b, dt, i, d.q, e, e + MAXE, &train) == ROLN_E_LENGTH);
    for (i = -1; i <= 0; i++) { /* motors, windows together */
        const roln_trained m = plain_trained(&p);
        const roln_errors_to both = {e, e + MAXE};
        const roln_gradient to = roln_gradient_of(&plain_model, g.theta, &g.loss, &g.windows);
        CHECK(plain_allocate(&p, &s, &(roln_motors){i, d.q, 1}, tau_z, u, NULL, &work) == ROLN_E_LENGTH);
        CHECK(roln_grad(&m, &ode_weights, &d.b, dt, i, &to, train.grad) == ROLN_E_LENGTH);
        CHECK(roln_grad_acc(&m, &acc_weights, &d.b, i, &to, train.grad_acc) == ROLN_E_LENGTH);
        CHECK(roln_errors(&m, &d.b, dt, i, 1, d.q, &both, train.errors) == ROLN_E_LENGTH);
    }
    d.b.count = 0; /* no windows: no variance, and nothing to add */
    CHECK(plain_variance(&p, &d.b, &var.loss, &train) == ROLN_E_LENGTH);
    CHECK_OK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train));
    CHECK_OK(plain_grad_acc(&p, &acc_weights, &d.b, &g, &train));
    d.b.count = 1, d.b.steps = plain_horizon + 1;
    CHECK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train) == ROLN_E_LENGTH);
    CHECK(all(plain_theta_size + TERMS + 1, numbers, 7) && all(TERMS, var.term, 7) && all(4, u, 7));
    CHECK(sizeof g == 2 * sizeof(roln_real) * (plain_theta_size + TERMS + 1) && p.scale.m == 1);
    for (i = 0; i < 2 * MAXE; i++)
        CHECK(memcmp(&e[i], &sevens, sizeof sevens) == 0);
}

/* ---- scratch is exact ------------------------------------------------------------------------- */

static members used; /* the most of its scratch that any call of a function has written */

#define USE(function, call) \
    do { \
        roln_real *const work = ROOM(function); \
        CHECK_OK(call); \
        ROOM_KEPT(); \
        if (room_used() > used.function) used.function = room_used(); \
    } while (0)

static void use_tick(int k, const roln_trained *m, const roln_real *x)
{
    const int N = N_OF(k), n = n_OF(k);
    static const roln_motors damped = {0, NULL, 1};
    roln_limits limits = {.dt = dt, .margin = 1, .power = 100, .tau = 100, .hold = 1, .q_off = 100, .qd_off = 100,
                                .motors = m->model->inputs > 0 ? &damped : NULL};
    const roln_target target = {x, x + n, x + 2 * n, x + 3 * n, x + 4 * n, NULL};
    const roln_measured full = {x, x + N};
    roln_real z[MAXN], zd[MAXN], zdd[MAXN], q[MAXN], qd[MAXN], tau_z[MAXN], tau[MAXN] = {0};
    roln_guard guard = {0, 0, 0, 0, 0, 0, 0};
    const roln_held held = {&guard, tau};
    const roln_motors motors = {ROLN_MIN(3, N), x, 1};
    int which[MAXN], i;
    for (i = 0; i < N; i++)
        which[i] = i;
    USE(encode, roln_encode(m, x, x + N, NULL, z, zd, NULL, work));
    USE(aim, roln_encode(m, x, x + N, x, z, zd, zdd, work));
    USE(decode, roln_decode(m, z, zd, q, qd, work));
    USE(decode_some, roln_decode_some(m, z, zd, N, which, q, qd, work));
    USE(control, roln_control(m, z, zd, &target, tau_z, work));
    USE(lift, roln_lift(m, z, tau_z, q, work));
    USE(gains, roln_gains(m, z, x, x, z, zd, work));
    USE(allocate, roln_allocate(m, z, &motors, tau_z, q, NULL, work));
    for (i = 0; i < 2; i++)
        USE(guard_tick, (roln_guard_tick(m, &limits, &full, z, zd, x, &held, work), ROLN_OK));
    for (i = 0; i < 2; i++)
        USE(tick, (roln_tick(m, &limits, &full, &target, z, zd, &held, work), ROLN_OK));
    limits.motors = m->model->inputs > 0 ? &damped : &motors;
    USE(tick, (roln_tick(m, &limits, &full, &target, z, zd, &held, work), ROLN_OK));
    CHECK(guard.known || m->model->inputs > 0); /* that is, the balance was computed */
}

static void use_lqr(int k, const roln_trained *m, const roln_real *x)
{
    static roln_real w[MAXN], K[2 * MAXN * 2 * MAXN], P[4 * MAXN * MAXN], s[6 * MAXN];
    static roln_real u[MAXN];
    const roln_cost cost = {w, w, u, dt, NULL};
    const int n2 = 2 * n_OF(k);
    fill(MAXN, 1, w), fill(MAXN, k == DEEP ? ROLN_C(1e8) : 1, u);
    memcpy(s, x, (size_t)n2 * sizeof *s), memcpy(s + n2, s, (size_t)n2 * sizeof *s), memcpy(s + 2 * n2, s, (size_t)n2 * sizeof *s);
    USE(lqr, roln_lqr(m, &cost, s, NULL, K, P, work));
    USE(lqr_along, roln_lqr_along(m, &cost, 2, s, NULL, P, K, work));
    USE(lqr_along, roln_lqr_along(m, &cost, 2, s, NULL, NULL, K, work));
}

static void use_plan(int k, const roln_trained *m, const roln_real *x)
{
    static roln_real w[MAXN], u[MAXN], A[16 * MAXN * MAXN], B[8 * MAXN * MAXN], c[8 * MAXN];
    static roln_real path[10 * MAXN], torque[4 * MAXN], K[8 * MAXN * MAXN];
    const int motors = models[k].size.motors;
    const roln_motors two = {motors, x, 0};
    const roln_limits limits = {.dt = dt, .margin = 1, .tau = 1, .rate = 8, .motors = m->model->inputs > 0 ? NULL : &two};
    const roln_term term[2] = {{.of = ROLN_OF_Q, .weight = w, .ref = x}, {.of = ROLN_OF_QD, .weight = w, .ref = x}};
    const roln_goal goal = {.dt = dt, .terms = 2, .term = term, .u = u, .limits = &limits};
    roln_plan plan = {0, 0, 0, 0};
    const roln_planned pl = {&plan, models[k].size.steps, motors, path, torque, K};
    fill(MAXN, 1, w), fill(MAXN, k == DEEP ? ROLN_C(1e8) : 1, u);
    USE(plan_next, roln_plan_next(m, &goal, x, &pl, work));
    USE(plan_linear, roln_plan_linear(m, &goal, &pl, A, B, c, work));
}

/* A start and a tick. */
static void use_filter(int k, const roln_trained *m, const roln_real *x)
{
    static roln_real F[9 * MAXN * MAXN];
    const int N = N_OF(k);
    const roln_batch b = {1, 1, 1, NULL, x, NULL, NULL, x};
    roln_noise noise = {.dt = dt, .q = 1, .tau = 1, .load = 1};
    roln_real z[MAXN], zd[MAXN], each[MAXN], load[MAXN];
    roln_filter filter = {0, 0, 0, 0, 0, 0, 0};
    const roln_estimate e = {&filter, z, zd, F, models[k].size.load ? load : NULL};
    int i;
    for (i = 0; i < 2; i++)
        USE(filter_tick, (roln_filter_tick(m, &noise, x + i * N, x, &e, work), filter.known ? ROLN_OK : ROLN_E_RANGE));
    USE(fit_noise, roln_fit_noise(m, &b, &noise, each, work));
}

static void use_limits(int k, const roln_trained *m, const roln_real *x)
{
    const int N = N_OF(k);
    const roln_batch b = {1, 1, 1, NULL, x, x + 2 * N, NULL, x};
    roln_limits limits = {.dt = dt};
    roln_real each[MAXN], rates[MAXN];
    USE(fit_limits, roln_fit_limits(m, &b, 1, &limits, each, rates, work));
}

static void use_mechanics(int k, const roln_trained *m, const roln_real *x)
{
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[MAXN], zd[MAXN], y[MAXN], A[256], B[256], M[64], c[MAXN], g[MAXN], d[MAXN], T = 0, V = 0;
    const roln_terms_out out = {M, c, g, d, &T, &V};
    int force, i;
    for (force = 0; force < 2; force++) {
        memcpy(z, x, sizeof z), memcpy(zd, x + MAXN, sizeof zd);
        USE(step, roln_step(m, z, zd, force ? x : NULL, dt / 8, work));
        USE(linear, roln_linear(m, z, zd, force ? x : NULL, dt / 8, A, B, work));
        USE(inverse, roln_inverse(m, z, zd, force ? x : NULL, x, y, work));
    }
    USE(reduce, roln_reduce(m, z, x, y, work));
    USE(terms, roln_terms(m, z, zd, &out, work));
    USE(inertia, roln_inertia(m, z, x, y, work));
    USE(fit_range, roln_fit_range(m, 3, x, x + 3 * N, y, c, g, work));
    for (i = 0; i < n; i++)
        CHECK(y[i] <= c[i]);
}

static void use_training(int k, const roln_trained *m, roln_real *theta, uint64_t *s)
{
    static data d;
    static roln_real g[MAXP], m1[MAXP], v[MAXP], v_max[MAXP];
    const int block = models[k].block;
    const roln_moments moments = {m1, v, v_max};
    roln_adam adam = {0, 0, 0};
    roln_real windows = 0, qbar[MAXN] = {0};
    roln_error e[MAXE];
    const roln_errors_to to_e = {e, NULL};
    terms t;
    roln_real unit_of_it;
    const roln_gradient to = roln_gradient_of(models[k].md, g, &t.loss, &windows);
    int kind, force, i;
    fill(TERMS, 0, t.term), fill(MAXP, 0, g), fill(MAXP, 0, m1), fill(MAXP, 0, v), fill(MAXP, 0, v_max);
    for (kind = 0; kind < KINDS; kind += 2)
        for (force = 0; force < 2; force++) {
            make(k, kind, block, s, &d);
            d.h = dt / 16;
            for (i = 0; i < MAXD && k == DEEP; i++) /* which multiplies by a thousand */
                d.q[i] /= 64, d.qd[i] /= 64, d.tau[i] /= 4096;
            if (!force) d.b.tau = NULL;
            if (is_acc(kind)) USE(grad_acc, roln_grad_acc(m, &weights.loss, &d.b, block, &to, work));
            else USE(grad, roln_grad(m, &weights.loss, &d.b, d.h, block, &to, work));
            if (block > 1 || kind != VAR) USE(variance, block > 1 ? roln_variance(m, &d.b, &t.loss, work) : ROLN_OK);
            if (kind == ACC && force) USE(fit_inertia, roln_fit_inertia(m, &d.b, &unit_of_it, work));
            if (kind == ODE) USE(errors, roln_errors(m, &d.b, d.h, block, 1, qbar, &to_e, work));
        }
    if (block == 1) { /* of more than one window */
        make(k, ACC, 4, s, &d);
        USE(variance, roln_variance(m, &d.b, &t.loss, work));
    }
    USE(update, roln_adam_update(models[k].blocks, models[k].table, &adam_options, 1 / windows, g, theta, &adam, &moments, work));
    USE(init, roln_ae_init(&m->model->ae, theta, s, work));
}

/* Every function with scratch, with all that makes it take more: its hungriest call writes as many numbers as are declared. */
static void check_exact(const char *name, const char *function, int declared, int written)
{
    if (!CHECK(written <= declared && written >= declared - 2))
        printf("    %s_%s: scratch of %d numbers declared, %d written\n", name, function, declared, written);
}
#define CHECK_EXACT(of, type, function) check_exact(models[k].name, #function, models[k].scratch.function, used.function);

static void test_scratch(int k)
{
    static roln_real theta[MAXP], x[256];
    roln_real low[MAXN], high[MAXN];
    const roln_trained m = {models[k].md, scale_of(k), low, high, high, theta, NULL};
    uint64_t s = 500 + (uint64_t)k;
    fill(MAXN, -100, low), fill(MAXN, 100, high);
    memset(&used, 0, sizeof used);
    parameters(k, &s, theta);
    CHECK_OK(roln_ae_init(&models[k].md->ae, theta, &s, ROOM(init)));
    dyadic(256, ROLN_C(0.5), &s, x);
    use_tick(k, &m, x);
    use_limits(k, &m, x);
    use_lqr(k, &m, x);
    use_plan(k, &m, x);
    use_filter(k, &m, x);
    use_mechanics(k, &m, x);
    use_training(k, &m, theta, &s);
    MEMBERS(CHECK_EXACT, )
}

/* ---- the shell -------------------------------------------------------------------------------- */

/* Scratch of a function in the union that the shell wants, and not a number more. */
#define PLAIN_WORK(member) ((plain_work *)(void *)room_of(NUMBERS_OF(plain_work, member)))
#define PLAIN_TRAIN(member) ((plain_train *)(void *)room_of(NUMBERS_OF(plain_train, member)))

static void check_in_range(const plain_params *p, const plain_latent *corner)
{
    plain_latent s = *corner;
    CHECK(plain_in_range(p, &s));
    s.z[1] = p->z_max[1] + 1;
    CHECK(!plain_in_range(p, &s));
    s.z[1] = (roln_real)NAN;
    CHECK(!plain_in_range(p, &s));
    s.z[1] = p->z_max[1];
    CHECK(plain_in_range(p, &s));
    s.zd[1] *= 1 + 4 * ROLN_EPS;
    CHECK(!plain_in_range(p, &s));
    s.zd[1] = (roln_real)NAN;
    CHECK(!plain_in_range(p, &s));
}

/* Every function of the shell is the generic one with the model filled in (those of control: test_control.c). */
static void test_shell(void)
{
    enum { SAMPLES = 4, ALL = SAMPLES * plain_N };
    static plain_params p;
    static plain_gradient g, g1;
    static plain_start start;
    roln_real q[ALL], qd[ALL], qdd[ALL], tau[ALL], tau_z[2], tau_z1[2], lifted[6], lifted1[6], M[4], c[2], gr[2], T = 0, V = 0;
    const roln_terms_out out = {M, c, gr, NULL, &T, &V};
    const roln_gradient to = roln_gradient_of(&plain_model, g1.theta, &g1.loss, &g1.windows);
    roln_batch b = {.count = SAMPLES, .steps = 0, .stride = 1, .q = q, .qd = qd, .qdd = qdd, .tau = tau};
    roln_trained m;
    plain_equation e;
    plain_latent s;
    uint64_t seed = 9;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start));
    m = plain_trained(&p);
    for (i = 0; i < ALL; i++) {
        q[i] = roln_normal(&seed) / 4;
        qd[i] = roln_normal(&seed), qdd[i] = roln_normal(&seed), tau[i] = roln_normal(&seed);
    }
    CHECK_OK(plain_fit_range(&p, SAMPLES, q, qd, PLAIN_WORK(fit_range)));
    ROOM_KEPT();
    memcpy(s.z, p.z_min, sizeof s.z), s.zd[0] = p.zd_max[0], s.zd[1] = -p.zd_max[1];
    check_in_range(&p, &s);
    s.zd[1] = -1;
    CHECK_OK(plain_reduce(&p, &s, tau, tau_z, PLAIN_WORK(reduce)));
    CHECK(roln_reduce(&m, s.z, tau, tau_z1, room) == ROLN_OK && same(2, tau_z, tau_z1));
    CHECK_OK(plain_lift(&p, &s, tau_z, lifted, PLAIN_WORK(lift)));
    CHECK(roln_lift(&m, s.z, tau_z, lifted1, room) == ROLN_OK && same(6, lifted, lifted1));
    CHECK_OK(plain_terms(&p, &s, &e, PLAIN_WORK(terms)));
    CHECK_OK(roln_terms(&m, s.z, s.zd, &out, room));
    CHECK(same(4, M, e.M) && same(2, c, e.c) && same(2, gr, e.g) && same(1, &T, &e.T) && same(1, &V, &e.V) && all(2, e.d, 0));
    CHECK(ROLN_ABS(M[1] - M[2]) <= 0);
    CHECK_OK(plain_grad_acc(&p, &acc_weights, &b, &g, PLAIN_TRAIN(grad_acc)));
    ROOM_KEPT();
    CHECK_OK(roln_grad_acc(&m, &acc_weights, &b, 16, &to, room));
    CHECK(memcmp(&g, &g1, sizeof g) == 0);
    CHECK_NEAR(roln_loss_total(&acc_weights, &g.loss), g.loss.q + g.loss.qd + g.loss.qdd + g.loss.zdd + g.loss.qdd_pred,
               8 * EPS * (ld)roln_loss_total(&acc_weights, &g.loss));
}

/* Two oscillators seen through six channels. */
enum { SAMPLES = 400 };
static void oscillators(roln_real *q, roln_real *qd)
{
    int k, c;
    for (k = 0; k < SAMPLES; k++)
        for (c = 0; c < 6; c++) {
            const double a = cos(k * 0.05), ad = -sin(k * 0.05), b = sin(k * 0.07 + 1), bd = 1.4 * cos(k * 0.07 + 1);
            const double e = 0.1 * (c - 2.5), f = 0.3 * (c % 3 - 1), odd = c % 2;
            q[k * 6 + c] = (roln_real)(e * a + f * b + 0.1 * a * a * odd);
            qd[k * 6 + c] = (roln_real)(e * ad + f * bd + 0.2 * a * ad * odd);
        }
}

/* A trained model packed and unpacked, and that its autoencoder is a projection still. */
static void check_trained(plain_params *p, const roln_real *q, const roln_real *qd, roln_real h)
{
    static plain_params again;
    static plain_work work;
    static unsigned char bytes[plain_packed_size];
    plain_state x, y;
    plain_latent z;
    int i;
    CHECK(plain_fit_range(p, SAMPLES, q, qd, &work) == ROLN_OK && p->z_min[0] < p->z_max[0]);
    p->dt = h;
    plain_pack(p, bytes);
    memset(&again, 0, sizeof again);
    CHECK(plain_unpack(plain_packed_size, bytes, &again) == ROLN_OK && memcmp(p, &again, sizeof *p) == 0);
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    CHECK_OK(plain_encode(p, &x, &z, &work));
    CHECK_OK(plain_decode(p, &z, &y, &work));
    x = y;
    CHECK_OK(plain_encode(p, &x, &z, &work));
    CHECK_OK(plain_decode(p, &z, &y, &work));
    for (i = 0; i < 6; i++)
        CHECK_NEAR(x.q[i], y.q[i], 60 * EPS), CHECK_NEAR(x.qd[i], y.qd[i], 200 * EPS);
}

/* 200 updates. */
static void test_training(void)
{
    enum { H = 4, BATCH = 8 };
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    static roln_real q[SAMPLES * 6], qd[SAMPLES * 6], qbar[6];
    static plain_params p, was;
    static plain_optimiser o, o_was;
    static plain_gradient g;
    static plain_start init;
    const roln_real h = ROLN_C(0.05);
    uint64_t s = 3;
    int start[BATCH], k, i;
    double first = 0, last = 0;
    roln_error e[2];
    roln_batch b = {.count = BATCH, .steps = H, .stride = 1, .start = start, .q = q, .qd = qd};
    oscillators(q, qd);
    for (k = 0; k < 2; k++) { /* what was there before does not show: with 0xff it is what it is with 0 */
        plain_params *at = k ? &was : &p;
        memset(at, k ? 0xff : 0, sizeof *at), s = 2;
        CHECK_OK(plain_init(at, &s, &init));
    }
    CHECK(memcmp(&p, &was, sizeof p) == 0);
    for (k = 0; k < 2; k++) {
        plain_params *at = k ? &was : &p;
        memset(at, k ? 0xff : 0, sizeof *at), s = 3;
        CHECK_OK(plain_init_pod(at, SAMPLES, q, qd, qbar, &s, &init));
    }
    CHECK(memcmp(&p, &was, sizeof p) == 0);
    for (k = 0; k < 200; k++) {
        for (i = 0; i < BATCH; i++)
            start[i] = roln_randint(SAMPLES - H, &s);
        memset(&g, 0, sizeof g);
        CHECK_OK(plain_grad(&p, &ode_weights, &b, h, &g, PLAIN_TRAIN(grad)));
        ROOM_KEPT();
        CHECK_OK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)));
        ROOM_KEPT();
        if (k < 10) first += (double)roln_loss_total(&ode_weights, &g.loss);
        if (k >= 190) last += (double)roln_loss_total(&ode_weights, &g.loss);
    }
    BOUND("loss, last / first", (ld)(last / first), 0.1);
    /* the shell at work: failures leave everything, bytes and back, errors, range */
    was = p, o_was = o;
    g.theta[5] = (roln_real)NAN;
    CHECK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)) == ROLN_E_NOT_FINITE);
    memset(&g, 0, sizeof g);
    CHECK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)) == ROLN_E_NOT_FINITE); /* no windows */
    CHECK(memcmp(&p, &was, sizeof p) == 0 && memcmp(&o, &o_was, sizeof o) == 0);
    b.steps = H + 1;
    CHECK(plain_grad(&p, &ode_weights, &b, h, &g, PLAIN_TRAIN(grad)) == ROLN_E_LENGTH);
    b.steps = 40, b.count = 4, start[0] = 0, start[1] = 90, start[2] = 180, start[3] = 270;
    CHECK_OK(plain_errors(&p, &b, h, 40, qbar, e, NULL, PLAIN_TRAIN(errors)));
    ROOM_KEPT();
    CHECK_BELOW(sqrt((double)(e[1].q / e[1].q_var)), 0.9);
    check_trained(&p, q, qd, h);
}

void TEST_NAME(roln)(void)
{
    int k, kind, own;
    for (k = 0; k < MODELS; k++) {
        for (kind = 0; kind < KINDS; kind++) {
            test_gradient(k, kind);
            test_grad_failures(k, kind);
            test_rows(k, kind);
        }
        test_grad_acc_free(k);
        test_own_positions(k);
        test_variance(k);
        test_fit_inertia(k);
        test_errors(k);
        test_update(k);
        for (own = 0; own < 2; own++)
            test_pack(k, own), test_sealed(k, own);
        test_some(k);
        test_sizes(k);
        test_scratch(k);
#ifndef ROLN_DOUBLE
        if (models[k].md->ae.layers > 0) test_stored(k, &roln_half), test_stored(k, &roln_int8);
#endif
    }
#ifndef ROLN_DOUBLE
    test_stored_shell();
#endif
    test_signs();
    test_weights();
    test_variance_units();
    test_rollout();
    test_write();
    test_needs();
    test_shuffle();
    test_fit();
    test_seam();
    test_shapes();
    test_statuses();
    test_settings();
    test_arguments();
    test_shell();
    test_training();
    print_bounds();
}
