/* SPDX-License-Identifier: MIT */
/* Gradients of a model (NAME_grad, NAME_grad_acc): every loss against a slow loss that uses the functions of prediction, and
   every gradient against central differences (double) or against that in double (float); blocks, units and weights; positions
   that a model made itself; blocks that fail. */

/* Every model in blocks of one window, */
#define CALLED(X) X(grad) X(grad_acc)
#define SMALL(name) one_##name
#define EVERY_BLOCK 1
#include "small_models.h"
#undef EVERY_BLOCK

/* by the midpoint rule, with windows of five steps, */
#undef CALLED
#define CALLED(X) X(step) X(grad)
#define SMALL(name) mid_##name
#define SMALL_STEP(scheme) midpoint
#define EVERY_HORIZON 5
#include "small_models.h"
#undef EVERY_HORIZON

/* and as it is. */
#undef CALLED
#ifdef ROLN_DOUBLE
#define CALLED(X) X(encode) X(decode) X(step) X(dynamics) X(reduce) X(grad) X(grad_acc) X(errors)
#else
#define CALLED(X) X(encode) X(decode) X(step) X(grad) X(grad_acc) X(errors)
#endif
#include "small.h"

#define ONE(name) one_##name##_called
#define MID(name) mid_##name##_called
static const model *const ones[MODELS] = SMALL_TABLE(ONE, ONE), *const mids[MODELS] = SMALL_TABLE(MID, MID);

#include "samples.h"

void TEST_NAME(gradient)(void);

/* The double gradient and loss, for the float test. */
void test_gradient_reference(int k, int kind, double *g, double *loss);
#ifdef ROLN_DOUBLE
void test_gradient_reference(int k, int kind, double *g, double *loss)
{
    static data d;
    static roln_real theta[MAXP];
    static gradient sum;
    const instance m = trained(models[k], scale_of(k), theta);
    uint64_t s = (uint64_t)(10 * k + kind);
    parameters(k, &s, theta);
    make(k, kind, 3, &s, &d);
    CHECK_OK(grad_of(&m, &d, &sum));
    memcpy(g, sum.theta, sizeof sum.theta), memcpy(loss, sum.t.term, sizeof sum.t.term);
}
#endif

/* ---- slow losses ------------------------------------------------------------------------------ */

/* |x - y|^2 of positions. */
static ld away(int k, int n, const roln_real *x, const roln_real *y)
{
    ld sum = 0;
    int i;
    for (i = 0; i < n; i++)
        sum += difference(k, i, (ld)x[i], (ld)y[i]) * difference(k, i, (ld)x[i], (ld)y[i]);
    return sum;
}

/* The ODE loss, sample by sample with the functions of prediction. */
static void slow_loss(int k, const instance *m, const data *d, ld *t)
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
            CHECK_OK(m->of->encode(m, q_data, qd_data, z, zd, ROOM(encode)));
            CHECK_OK(m->of->decode(m, z, zd, q, qd, ROOM(decode)));
            t[Q] += away(k, N, q, q_data) * q2 / (H + 1);
            t[QD] += apart(N, qd, qd_data) * q2 * time2 / (H + 1);
            if (h == 0) {
                memcpy(z_pred, z, sizeof z), memcpy(zd_pred, zd, sizeof zd);
                continue;
            }
            mean_force(b, F_OF(k), sample - b->stride, tau);
            CHECK_OK(m->of->step(m, z_pred, zd_pred, b->tau ? tau : NULL, d->h, ROOM(step)));
            ROOM_KEPT();
            CHECK_OK(m->of->decode(m, z_pred, zd_pred, q, qd, ROOM(decode)));
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
static void slow_decode(int k, const instance *m, const double *z, const double *zd, const double *zdd, double *qdd)
{
    double v[4][MAXN], zt[MAXN], zdt[MAXN], q[MAXN];
    int i, j;
    for (j = 0; j < 4; j++) {
        along(n_OF(k), z, zd, zdd, shift[j], zt, zdt);
        CHECK_OK(m->of->decode(m, zt, zdt, q, v[j], ROOM(decode)));
    }
    for (i = 0; i < N_OF(k); i++)
        qdd[i] = slope(v, i);
}

/* The acceleration loss: second time derivatives of encoder and decoder by Richardson differences along a parabola. */
static void slow_loss_acc(int k, const instance *m, const roln_batch *b, ld *t)
{
    const int N = N_OF(k), n = n_OF(k);
    const ld time2 = (ld)m->scale->t * (ld)m->scale->t, q2 = 1 / ((ld)m->scale->q * (ld)m->scale->q);
    double v[4][MAXN], z[MAXN], zd[MAXN], zdd[MAXN], zdd_pred[MAXN], q[MAXN], qd[MAXN], qdd[MAXN], tau[MAXN], tau_z[MAXN];
    double M[64], c[MAXN], g[MAXN], d[MAXN];
    const terms_at out = {M, c, g, d, NULL, NULL};
    int w, i, j;
    for (w = 0; w < b->count; w++) {
        const int first = first_of(b, w), at = first * N;
        const double *q_data = b->q + at, *qd_data = b->qd + at, *qdd_data = b->qdd + at;
        for (j = 0; j < 4; j++) {
            along(N, q_data, qd_data, qdd_data, shift[j], q, qd);
            CHECK_OK(m->of->encode(m, q, qd, z, v[j], ROOM(encode)));
        }
        for (i = 0; i < n; i++)
            zdd[i] = slope(v, i);
        CHECK_OK(m->of->encode(m, q_data, qd_data, z, zd, ROOM(encode)));
        CHECK_OK(m->of->dynamics(m, z, zd, &out, ROOM(dynamics)));
        for (i = 0; i < F_OF(k); i++)
            tau[i] = b->tau ? b->tau[first * F_OF(k) + i] : 0;
        CHECK_OK(m->of->reduce(m, z, tau, tau_z, ROOM(reduce)));
        for (i = 0; i < n; i++) {
            double r = zdd_pred[i] = tau_z[i] - c[i] - g[i] - d[i];
            for (j = 0; j < n; j++)
                r -= M[i * n + j] * zdd[j];
            t[FORCE] += (ld)(r * r) * time2 * time2;
        }
        CHECK_OK(roln_chol(n, M, M));
        roln_solve_lower(n, M, zdd_pred, zdd_pred), roln_solve_lower_t(n, M, zdd_pred, zdd_pred);
        t[ZDD] += apart(n, zdd_pred, zdd) * time2 * time2;
        CHECK_OK(m->of->decode(m, z, zd, q, qd, ROOM(decode)));
        t[Q] += apart(N, q, q_data) * q2;
        t[QD] += apart(N, qd, qd_data) * q2 * time2;
        slow_decode(k, m, z, zd, zdd, qdd);
        t[QDD] += apart(N, qdd, qdd_data) * q2 * time2 * time2;
        slow_decode(k, m, z, zd, zdd_pred, qdd);
        t[QDD_PRED] += apart(N, qdd, qdd_data) * q2 * time2 * time2;
    }
}

/* The start from two positions, M(z1) zd1 = M(z_m) v + h/2 F(z_m, v), with grad_z T by differences of the kinetic energy. */
static void slow_start(int k, const instance *m, const double *z0, const double *z1, const double *tau, double h, double *zd1)
{
    static const double c[4] = {4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
    const int n = n_OF(k);
    double zm[MAXN], v[MAXN], M[64], M1[64], g[MAXN], d[MAXN], T = 0, tau_z[MAXN], p[MAXN];
    const terms_at middle = {M, NULL, g, d, &T, NULL}, end = {M1, NULL, NULL, NULL, NULL, NULL};
    const terms_at kinetic = {NULL, NULL, NULL, NULL, &T, NULL};
    int i, j, s;
    for (i = 0; i < n; i++) {
        zm[i] = (z0[i] + z1[i]) / 2;
        v[i] = (z1[i] - z0[i]) / h;
    }
    CHECK_OK(m->of->dynamics(m, zm, v, &middle, ROOM(dynamics)));
    CHECK_OK(m->of->reduce(m, zm, tau, tau_z, ROOM(reduce)));
    CHECK_OK(m->of->dynamics(m, z1, v, &end, ROOM(dynamics)));
    for (i = 0; i < n; i++) {
        const double was = zm[i];
        double slope_T = 0;
        for (s = 1; s <= 8; s++) {
            const int sign = s % 2 ? 1 : -1;
            zm[i] = was + sign * ((s + 1) / 2) * 4e-3;
            CHECK_OK(m->of->dynamics(m, zm, v, &kinetic, ROOM(dynamics)));
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
static void slow_loss_positions(int k, const instance *m, const data *dat, ld *t)
{
    const instance mid = trained(mids[k], m->scale, m->theta);
    const roln_batch *b = &dat->b;
    const int N = N_OF(k), n = n_OF(k), H = b->steps;
    const ld q2 = 1 / ((ld)m->scale->q * (ld)m->scale->q);
    double z[10][MAXN], still[MAXN] = {0}, none[MAXN], z_pred[MAXN], zd_pred[MAXN], tau[MAXN], q[MAXN];
    int w, h;
    for (w = 0; w < b->count; w++)
        for (h = 0; h <= H; h++) {
            const int sample = first_of(b, w) + h * b->stride;
            const double *q_data = b->q + sample * N;
            CHECK_OK(m->of->encode(m, q_data, still, z[h], none, ROOM(encode)));
            CHECK_OK(m->of->decode(m, z[h], still, q, none, ROOM(decode)));
            t[Q] += away(k, N, q, q_data) * q2 / (H + 1);
            if (h == 0) continue;
            mean_force(b, F_OF(k), sample - b->stride, tau);
            if (h == 1) {
                slow_start(k, m, z[0], z[1], tau, dat->h, zd_pred);
                memcpy(z_pred, z[1], sizeof z_pred);
                continue;
            }
            CHECK_OK(mid.of->step(&mid, z_pred, zd_pred, b->tau ? tau : NULL, dat->h, spare));
            CHECK_OK(m->of->decode(m, z_pred, zd_pred, q, none, ROOM(decode)));
            t[Z] += away(k, n, z_pred, z[h]) / (H - 1);
            t[Q_PRED] += away(k, N, q, q_data) * q2 / (H - 1);
        }
}
#endif

/* ---- gradients -------------------------------------------------------------------------------- */

/* A model, data of a kind, and the gradient and loss there, to which everything else is compared. */
typedef struct {
    int k, kind, params;
    roln_real theta[MAXP];
    instance m;
    data d;
    gradient g;
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
        const int there = !all(1, x->g.t.term + i, 0);
        if (x->kind <= ODE_FREE) BOUND("loss, eps", fabsl((ld)x->g.t.term[i] - slow[i]) / ((slow[i] + EPS) * EPS), 100);
        else CHECK_NEAR(x->g.t.term[i], slow[i], 1e-8L * slow[i] + 1e-20L);
        CHECK(there == has_term[x->kind / 2][i] || models[x->k]->md->ae.layers == 0);
    }
}

#ifdef ROLN_DOUBLE
/* Every parameter by central differences of the loss, in kinds other than ODE every third. */
static void check_gradient(subject *x)
{
    static gradient g;
    const double h = 3e-4, move[4] = {h, -h, 2 * h, -2 * h};
    int i, p;
    for (i = 0; i < x->params; i++) {
        const int j = mate(x->k, i);
        const double was = x->theta[i];
        double l[4], slope_of_it;
        if (x->kind != ODE && i % 3 != x->kind % 3) continue;
        for (p = 0; p < 4; p++) {
            x->theta[i] = x->theta[j] = was + move[p];
            CHECK_OK(grad_of(&x->m, &x->d, &g));
            l[p] = weighted(&g.t);
        }
        x->theta[i] = x->theta[j] = was;
        slope_of_it = (8 * (l[0] - l[1]) - (l[2] - l[3])) / (12 * h);
        BOUND("gradient", fabsl((ld)(x->g.theta[i] + (i == j ? 0 : x->g.theta[j])) - (ld)slope_of_it) / x->top, 1e-8);
    }
}
#else
/* Every parameter against the gradient in double. */
static void check_gradient(const subject *x)
{
    static double g[MAXP], loss[TERMS];
    int i;
    test_gradient_reference(x->k, x->kind, g, loss);
    for (i = 0; i < x->params; i++)
        BOUND("gradient, eps", fabsl((ld)x->g.theta[i] - (ld)g[i]) / (x->top * EPS), 160 * x->amp);
    for (i = 0; i < TERMS; i++)
        BOUND("loss against double, eps", fabsl((ld)x->g.t.term[i] - (ld)loss[i]) / (((ld)loss[i] + EPS) * EPS), 80 * x->amp);
}
#endif

/* The gradient in blocks of `block` windows, 1 or 2: of a model that has no others, and in calls that have no more. */
static void in_blocks(const subject *x, int block, gradient *g)
{
    static data part;
    const instance m = trained(ones[x->k], x->m.scale, x->theta);
    int w;
    if (block == 1) {
        CHECK_OK(grad_of(&m, &x->d, g));
        return;
    }
    memset(g, 0, sizeof *g);
    for (w = 0; w < x->d.b.count; w += block) {
        some_windows(&x->d, w, ROLN_MIN(block, x->d.b.count - w), &part);
        CHECK_OK(add_grad(&x->m, &weights.loss, &part, g));
    }
}

/* Blocks of one, two, sixteen windows agree; three windows are the sum of single ones, bit for bit. */
static void check_blocks(const subject *x)
{
    static gradient g, sum;
    static data one;
    int w, i;
    for (w = 2; w >= 1; w--) {
        in_blocks(x, w, &g);
        BOUND("gradient in other blocks, eps", furthest(x->params, g.theta, x->g.theta) / (x->top * EPS), 12 * x->amp);
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(g.t.term[i], x->g.t.term[i], 20 * EPS * (ld)x->g.t.term[i]);
    }
    memset(&sum, 0, sizeof sum);
    for (w = 0; w < 3; w++) {
        some_windows(&x->d, w, 1, &one);
        CHECK_OK(add_grad(&x->m, &weights.loss, &one, &sum));
    }
    CHECK(all(1, &sum.windows, 3) && same(x->params, g.theta, sum.theta)); /* g is of blocks of one */
    CHECK_BELOW(furthest(x->params, sum.theta, x->g.theta) / (x->top * EPS), 12 * x->amp);
}

/* Scales that are powers of two: the model of scales 1 on scaled data gives the same bits. */
static void check_units(const subject *x)
{
    static gradient g;
    static data u;
    const instance m = trained(x->m.of, &unit, x->theta);
    const roln_real q = scale_of(x->k)->q, c = scale.t, heavier = 4;
    const roln_scale heavy = {q, c, heavier};
    const instance hm = trained(x->m.of, &heavy, x->theta);
    int i;
    u = x->d, u.h = x->d.h / c, u.b.q = u.q;
    u.b.qd = x->d.b.qd ? u.qd : NULL, u.b.qdd = x->d.b.qdd ? u.qdd : NULL, u.b.tau = x->d.b.tau ? u.tau : NULL;
    for (i = 0; i < MAXD; i++) {
        u.q[i] /= q;
        u.qd[i] *= c / q;
        u.qdd[i] *= c * c / q;
        u.tau[i] *= q * c * c;
    }
    CHECK_OK(grad_of(&m, &u, &g));
    CHECK(same(x->params, g.theta, x->g.theta) && same(TERMS, g.t.term, x->g.t.term));
    u = x->d;
    for (i = 0; i < MAXD; i++)
        u.tau[i] *= heavier;
    u.b.tau = x->d.b.tau ? u.tau : NULL;
    CHECK_OK(grad_of(&hm, &u, &g));
    CHECK(same(x->params, g.theta, x->g.theta) && same(TERMS, g.t.term, x->g.t.term));
}

static void test_gradient(int k, int kind)
{
    static subject x;
    uint64_t s = (uint64_t)(10 * k + kind);
    x.k = k, x.kind = kind, x.params = models[k]->params;
    x.m = trained(models[k], scale_of(k), x.theta);
    CHECK(x.params <= MAXP);
    parameters(k, &s, x.theta);
    make(k, kind, 3, &s, &x.d);
    x.amp = is_var(kind) ? (ld)scale.t / (ld)x.d.h : 1;
    CHECK_OK(grad_of(&x.m, &x.d, &x.g));
    x.top = largest(x.params, x.g.theta);
    check_loss(&x);
    check_gradient(&x);
    check_blocks(&x);
    check_units(&x);
}

/* Weights of zero switch terms off: the gradient is linear in the weights, one term at a time. */
static void test_weights(void)
{
    static data d;
    static roln_real theta[MAXP];
    static gradient sum, g;
    const instance m = trained(models[PLAIN], &scale, theta);
    uint64_t s = 5;
    terms one;
    int kind, i;
    parameters(PLAIN, &s, theta);
    for (kind = ODE; kind < KINDS; kind += 2) {
        make(PLAIN, kind, 3, &s, &d);
        CHECK_OK(grad_of(&m, &d, &g));
        memset(&sum, 0, sizeof sum);
        for (i = 0; i < TERMS; i++) {
            fill(TERMS, 0, one.term);
            one.term[i] = weights.term[i];
            CHECK_OK(add_grad(&m, &one.loss, &d, &sum));
        }
        CHECK_BELOW(furthest(plain_theta_size, g.theta, sum.theta) / (largest(plain_theta_size, g.theta) * EPS), 40);
    }
}

/* The acceleration loss without forces is the one with forces of 0, wherever its windows begin. */
static void test_grad_acc_free(int k)
{
    static data d;
    static roln_real theta[MAXP];
    static gradient g, free_g;
    const instance m = trained(models[k], scale_of(k), theta);
    uint64_t s = 25 + (uint64_t)k;
    int kind;
    parameters(k, &s, theta);
    for (kind = ACC; kind <= ACC_STARTS; kind++) {
        make(k, kind, 3, &s, &d);
        fill(MAXD, 0, d.tau);
        CHECK_OK(grad_of(&m, &d, &g));
        d.b.tau = NULL;
        CHECK_OK(grad_of(&m, &d, &free_g));
        CHECK(furthest(models[k]->params, g.theta, free_g.theta) <= 0 && furthest(TERMS, g.t.term, free_g.t.term) <= 0 &&
              largest(TERMS, g.t.term) > 0);
    }
}

/* Windows of H < 2 positions only reconstruct; the acceleration loss and the errors need velocities. */
static void check_too_short(int k, const instance *m, data *d)
{
    static const roln_loss reconstruction = {.q = 1};
    static gradient g;
    static roln_real none[GRADIENT_SIZE(MAXP)];
    const int ae = roln_ae_params(&models[k]->md->ae), params = models[k]->params;
    roln_error e[1];
    for (d->b.steps = 1; d->b.steps >= 0; d->b.steps--) {
        CHECK(grad_of(m, d, &g) == ROLN_E_LENGTH && all(params, g.theta, 0));
        memset(&g, 0, sizeof g);
        CHECK_OK(add_grad(m, &reconstruction, d, &g));
        CHECK(all(params - ae, g.theta + ae, 0) && g.t.loss.z <= 0 && g.t.loss.q_pred <= 0);
    }
    d->b.steps = 0;
    CHECK(m->of->grad_acc(m, &reconstruction, &d->b, none, ROOM(grad_acc)) == ROLN_E_LENGTH);
    CHECK(m->of->errors(m, &d->b, d->h, 1, d->q, &(roln_errors){e, NULL, NULL}, ROOM(errors)) == ROLN_E_LENGTH);
}

/* Positions that the model itself made with the midpoint rule, any damping, forces and layers: no prediction error, at H = 2
   and more; and none of it without forces, or where one position is off. */
static void test_own_positions(int k)
{
    enum { H = 5 };
    static data d;
    static roln_real theta[MAXP];
    static gradient g, other;
    const instance m = trained(models[k], scale_of(k), theta), mid = trained(mids[k], scale_of(k), theta);
    const int N = N_OF(k), n = n_OF(k), size = F_OF(k);
    const ld wild = k == DEEP ? 1e10L : 1;
    roln_real z[MAXN], zd[MAXN], qd[MAXN];
    uint64_t s = 110 + (uint64_t)k;
    int h;
    parameters(k, &s, theta);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta, &s, ROOM(init)));
    make(k, VAR, 1, &s, &d);
    dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.25), &s, zd);
    dyadic((H + 1) * size, k == DEEP ? ROLN_C(0.0009765625) : ROLN_C(0.25), &s, d.tau);
    for (h = 0; h <= H; h++) {
        CHECK_OK(m.of->decode(&m, z, zd, d.q + h * N, qd, ROOM(decode)));
        if (h < H) CHECK_OK(mid.of->step(&mid, z, zd, d.tau + h * size, d.h, spare));
    }
    for (d.b.steps = H; d.b.steps >= 2; d.b.steps--) {
        CHECK_OK(grad_of(&mid, &d, &g));
        /* positions are good to eps |q|, velocities to eps |q| / h, and the steps multiply that by H: (64 H 300 eps)^2 */
        BOUND("own motion", ((ld)g.t.loss.z + (ld)g.t.loss.q_pred) / (EPS * EPS) / (wild * 1e10L), 1);
    }
    d.b.steps = H;
    if (k != DEEP) { /* a wrong force, a wrong position */
        d.tau[size] += 1;
        CHECK_OK(grad_of(&mid, &d, &other));
        CHECK((ld)other.t.loss.z > PICK(4, 1000) * (ld)g.t.loss.z);
        d.tau[size] -= 1, d.q[2 * N] += ROLN_C(0.0078125);
        CHECK_OK(grad_of(&mid, &d, &other));
        CHECK(other.t.loss.z > ROLN_C(1e-7));
    }
    check_too_short(k, &m, &d);
}

/* ---- failures --------------------------------------------------------------------------------- */

/* A block that fails adds nothing: NaN and infinity in every number of the second window, in blocks of one. */
static void test_grad_failures(int k, int kind)
{
    static data d;
    static roln_real theta[MAXP];
    static gradient g, first;
    const instance m = trained(models[k], scale_of(k), theta), one = trained(ones[k], scale_of(k), theta);
    const int params = models[k]->params;
    const struct {
        roln_real *x;
        int size, skip;
    } fields[4] = {
        {.x = d.q, .size = N_OF(k)},
        {.x = d.qd, .size = N_OF(k), .skip = is_var(kind)},
        {.x = d.qdd, .size = N_OF(k), .skip = !is_acc(kind)},
        /* the windows of ACC_STARTS share forces */
        {.x = d.tau, .size = F_OF(k), .skip = kind == ODE_FREE || kind == ACC_STARTS || kind == VAR_FREE},
    };
    uint64_t s = 81;
    int i, f, b, length;
    parameters(k, &s, theta);
    make(k, kind, 2, &s, &d);
    length = d.b.steps * d.b.stride + 1;
    d.b.start = NULL;
    d.b.count = 1;
    CHECK_OK(grad_of(&one, &d, &first));
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
                CHECK(grad_of(&one, &d, &g) == ROLN_E_NOT_FINITE && same(params, g.theta, first.theta));
                *x = was;
            }
    }
    for (i = 0; i < params; i++) { /* so does a broken parameter, whether it matters or not */
        const roln_real was = theta[i];
        theta[i] = (roln_real)NAN;
        CHECK(grad_of(&m, &d, &g) == ROLN_E_NOT_FINITE && all(params, g.theta, 0));
        theta[i] = was;
    }
}

void TEST_NAME(gradient)(void)
{
    int k, kind;
    for (k = 0; k < MODELS; k++) {
        for (kind = 0; kind < KINDS; kind++) {
            test_gradient(k, kind);
            test_grad_failures(k, kind);
        }
        test_grad_acc_free(k);
        test_own_positions(k);
    }
    test_weights();
    print_bounds();
}
