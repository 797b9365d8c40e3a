/* SPDX-License-Identifier: MIT */
/* What the experiments rest on, and their headline rows: committed weights on freshly simulated trajectories. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../unit/check.h"
#include "recipes.h"

/* rows of configs.h */
extern const struct config test_layers_kind, test_layers_whole_kind, test_chart_kind, test_chart_whole_kind, test16_kind;
extern const struct config test2_kind, test2_damped_kind, test_pend16_kind, test16_poly_kind, test2_poly_kind;
extern const struct config cloth_free_half_kind, cloth_free_int8_kind;

/* Directions kept of the POD and of the whole space of 16. */
enum { R = 7, N = 16 };

/* A model trained in POD coordinates and the same in the full ones, with its first layer multiplied out or, of a chart, with one
   more layer, say the same, and the latter's encoder is still the left inverse of its decoder. */
static void compose(const struct config *in_pod, const struct config *whole, double zoom, const struct stage stage, double expected)
{
    struct motion d, a;
    struct pod p;
    struct model m, b;
    double samples = 0, off = 0, inverse = 0;
    if (!CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TRAIN, 0, 2, 0, NULL) == 0) || !CHECK(pod_fit(&p, &d, R) == 0) ||
        !CHECK(motion_project(&a, &d, &p) == 0) || !CHECK(model_init(&m, in_pod, zoom, &a, 3) == 0) ||
        !CHECK(model_train(&m, &a, &stage, 1e9, 3, &samples) == 0) || !CHECK(model_compose(&b, &m, whole, &p, d.mean) == 0))
        return;
    CHECK(samples == expected);
    const struct predictor small = model_predictor(&m), full = model_predictor(&b);
    for (int i = 0; i < 6000; i += 500) {
        roln_real s[6], t[6], x[R], xd[R], q[N], qd[N], z[6];
        CHECK(small.encode(small.self, a.q + i * R, a.qd + i * R, s) == ROLN_OK);
        CHECK(full.encode(full.self, d.q + i * N, d.qd + i * N, t) == ROLN_OK);
        for (int k = 0; k < 6; k++)
            off = fmax(off, fabs((double)(s[k] - t[k])) / (1 + fabs((double)s[k])));
        CHECK(small.step(small.self, s, NULL, .01) == ROLN_OK && full.step(full.self, t, NULL, .01) == ROLN_OK);
        CHECK(small.decode(small.self, s, x, xd) == ROLN_OK && full.decode(full.self, t, q, qd) == ROLN_OK);
        for (int k = 0; k < R; k++) { /* W^T (q - mean) = x */
            double y = 0;
            for (int j = 0; j < N; j++)
                y += p.W[j * R + k] * (double)(q[j] - d.mean[j]);
            off = fmax(off, fabs(y - (double)x[k]));
        }
        CHECK(full.encode(full.self, q, qd, z) == ROLN_OK);
        for (int k = 0; k < 6; k++)
            inverse = fmax(inverse, fabs((double)(z[k] - t[k])) / (1 + fabs((double)t[k])));
    }
    CHECK_BELOW(off, 2e-5);
    CHECK_BELOW(inverse, 2e-5);
    model_free(&m), model_free(&b), pod_free(&p), motion_free(&a), motion_free(&d);
}

static void test_compose(void)
{
    const struct stage adam = {.kind = STAGE_ACC,
                               .most = 300,
                               .batch = 16,
                               .lr_ae = .05,
                               .lr_net = 1e-3,
                               .fall = 1e-2,
                               .w_q = 2,
                               .w_acc = .1,
                               .w_qd = 1,
                               .bias = .3};
    const struct stage turn = {.kind = STAGE_CHART, .most = 5, .batch = 500};
    compose(&test_layers_kind, &test_layers_whole_kind, 2, adam, 300 * 16);
    compose(&test_chart_kind, &test_chart_whole_kind, 1, turn, 6000);
}

/* ---- charts and Gauss-Newton ---- */

/* A chart model as the predictor uses it: velocities and accelerations are derivatives of positions, the encoder is the inverse,
   and turning its encoder makes it better than the POD it began with. */
static void test_chart(void)
{
    const struct stage fit = {.kind = STAGE_CHART, .batch = 0}, turn = {.kind = STAGE_CHART, .most = 60, .batch = 2000};
    struct motion d;
    struct model m;
    double samples = 0, error[2], off = 0, inverse = 0;
    if (!CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TRAIN, 0, 4, 0, NULL) == 0) ||
        !CHECK(model_init(&m, &test16_kind, 1, &d, 3) == 0))
        return;
    const struct predictor p = model_predictor(&m);
    for (int k = 0; k < 2; k++) {
        double e = 0, var = 0;
        CHECK(model_train(&m, &d, k ? &turn : &fit, 1e9, 1, &samples) == 0);
        for (int i = 0; i < d.count * d.samples; i += 40) {
            roln_real s[8], q[N], qd[N];
            CHECK(p.encode(p.self, d.q + i * N, d.qd + i * N, s) == ROLN_OK && p.decode(p.self, s, q, qd) == ROLN_OK);
            for (int j = 0; j < N; j++)
                e += pow((double)(q[j] - d.q[i * N + j]), 2), var += pow((double)(d.q[i * N + j] - d.mean[j]), 2);
        }
        error[k] = sqrt(e / var);
    }
    CHECK_BELOW(error[0], .1);
    CHECK_BELOW(error[1], error[0] / 5);
    for (int i = 0; i < d.count * d.samples; i += 400) {
        const roln_real h = ROLN_C(1e-2);
        roln_real s[8], t[8], u[8], q[N], qd[N], up[N], down[N], unused[N], y[N], z[12];
        CHECK(p.encode(p.self, d.q + i * N, d.qd + i * N, s) == ROLN_OK && p.decode(p.self, s, q, qd) == ROLN_OK);
        CHECK(p.encode(p.self, q, qd, t) == ROLN_OK);
        for (int k = 0; k < 8; k++)
            inverse = fmax(inverse, fabs((double)(s[k] - t[k])) / (1 + fabs((double)s[k])));
        for (int k = 0; k < 4; k++)
            t[k] = s[k] + h * s[4 + k], u[k] = s[k] - h * s[4 + k], t[4 + k] = u[4 + k] = s[4 + k];
        CHECK(p.decode(p.self, t, up, unused) == ROLN_OK && p.decode(p.self, u, down, unused) == ROLN_OK);
        for (int k = 0; k < 4; k++)
            z[k] = s[k], z[4 + k] = s[4 + k] * m.sc->t, z[8 + k] = 0;
        model_lift(&m, z, y); /* zdd = 0: what is left is the second derivative along the straight line */
        for (int j = 0; j < N; j++) {
            off = fmax(off, fabs((double)((up[j] - down[j]) / (2 * h) - qd[j])) / (1 + fabs((double)qd[j])));
            off = fmax(off, fabs((double)((up[j] - 2 * q[j] + down[j]) / (h * h) - y[j])) / (20 + fabs((double)y[j])));
        }
    }
    CHECK_BELOW(off, 1e-2);
    CHECK_BELOW(inverse, 2e-5);
    model_free(&m), motion_free(&d);
}

/* Rows of `task` at x against differences of residuals along random directions, to 1 % and rounding. */
static void check_rows(const struct newton_task *task, int params, const roln_real *x, double share)
{
    enum { ROWS = 12 };
    const roln_real h = ROLN_C(5e-3);
    roln_real *J = calloc((size_t)(ROWS * params), sizeof *J), *v = calloc((size_t)(3 * params), sizeof *v);
    roln_real *up = v + params, *down = up + params, r[ROWS], a[ROWS], b[ROWS];
    uint64_t seed = 5;
    if (!CHECK(J && v)) exit(1);
    task->draw(task->self, ROWS, share, &seed);
    task->rows(task->self, x, 0, ROWS, J, r);
    for (int k = 0; k < 4; k++) {
        double norm = 0, worst = 0, top = 0, size = 0;
        for (int i = 0; i < params; i++)
            v[i] = roln_normal(&seed), norm += (double)(v[i] * v[i]);
        for (int i = 0; i < params; i++) {
            v[i] /= (roln_real)sqrt(norm / 30);
            up[i] = x[i] + h * v[i], down[i] = x[i] - h * v[i];
        }
        task->rows(task->self, up, 0, ROWS, NULL, a), task->rows(task->self, down, 4, ROWS - 4, NULL, b + 4);
        task->rows(task->self, down, 0, 4, NULL, b); /* in parts: the same rows */
        for (int i = 0; i < ROWS; i++) {
            const double slope = (double)((b[i] - a[i]) / (2 * h)), row = (double)roln_dot(params, J + i * params, v);
            worst = fmax(worst, fabs(slope - row)), top = fmax(top, fabs(row)), size = fmax(size, fabs((double)r[i]));
        }
        CHECK_BELOW(worst, 1e-2 * top + 4 * (double)(ROLN_EPS / h) * size);
    }
    task->rows(task->self, x, 0, ROWS, NULL, a);
    CHECK(memcmp(a, r, sizeof r) == 0);
    free(J), free(v);
}

/* rms of so many residuals. */
static double size_of_rows(const struct newton_task *task, const roln_real *x)
{
    roln_real r[300];
    uint64_t seed = 77;
    task->draw(task->self, 300, 0, &seed);
    task->rows(task->self, x, 0, 300, NULL, r);
    return sqrt((double)roln_dot(300, r, r) / 300);
}

/* Of RO-LNN on a chart, and of the latent models on the same one, under forces and without. */
static void test_rows(void)
{
    static const struct {
        enum truth_system system;
        double force;
        const struct config *kind;
    } cases[] = {{TRUTH_PEND16_PD, 1, &test16_kind},
                 {TRUTH_PEND2_ACT, 1, &test2_damped_kind},
                 {TRUTH_PEND16_PD, 1, &test16_poly_kind},
                 {TRUTH_PEND2_ACT, 1, &test2_poly_kind}};
    const struct stage fit = {.kind = STAGE_CHART, .batch = 0},
                       s = {.kind = STAGE_NEWTON, .batch = 300, .share = .5, .steps = 4, .stride = 5};
    for (size_t c = 0; c < sizeof cases / sizeof *cases; c++) {
        struct motion d;
        struct model m;
        struct baseline b = {&m, NULL, NULL, {0}};
        double samples = 0;
        if (!CHECK(motion_simulate(&d, cases[c].system, TRUTH_TRAIN, 0, 3, cases[c].force, NULL) == 0) ||
            !CHECK(model_init(&m, cases[c].kind, 1, &d, 3) == 0) || !CHECK(model_train(&m, &d, &fit, 1e9, 1, &samples) == 0))
            return;
        const int front = m.kind->front;
        struct newton_task *task = model_task(&m, &d, &s, &samples);
        check_rows(task, m.kind->params - front, m.theta + front, 0);
        check_rows(task, m.kind->params - front, m.theta + front, 1);
        model_task_free(task);
        for (int kind = 0; kind < LATENT_KINDS; kind++) {
            b.latent = latent_new((enum latent_kind)kind, m.kind->n, 1, 1, 4);
            if (!CHECK(b.latent && (task = baseline_task(&b, &d, &s, &samples)))) return;
            check_rows(task, latent_params(b.latent), latent_theta(b.latent), 0);
            check_rows(task, latent_params(b.latent), latent_theta(b.latent), 1);
            baseline_task_free(task), latent_free(b.latent);
        }
        model_free(&m), motion_free(&d);
    }
}

/* Rows that have no residual but at the start, or of which some have none anywhere. */
struct edge {
    struct newton_task task;
    const struct newton_task *inner;
    const roln_real *start;
    int params, holes; /* holes > 0: one row in so many */
};

static void edge_draw(void *self, int count, double share, uint64_t *seed)
{
    const struct edge *e = self;
    e->inner->draw(e->inner->self, count, share, seed);
}

static void edge_rows(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r)
{
    const struct edge *e = self;
    const int at_start = memcmp(x, e->start, (size_t)e->params * sizeof *x) == 0;
    e->inner->rows(e->inner->self, x, from, count, J, r);
    for (int k = 0; k < count; k++)
        if (e->holes == 0 ? !at_start : (from + k) % e->holes == 0) r[k] = (roln_real)NAN;
}

/* On four recordings of two joints: a short stage lowers the residual tenfold, and further if it is called again; the same bits
   again; windows weigh three times as much; Adam and L-BFGS lower it, too; steps that lead to where there is nothing are refused
   and leave all as it was. */
static void test_newton(void)
{
    const struct stage s = {.kind = STAGE_NEWTON, .most = 120, .batch = 300, .share = .05, .steps = 5, .stride = 10};
    const struct stage others[] = {{.kind = STAGE_LBFGS, .most = 200, .batch = 500},
                                   {.kind = STAGE_ACC, .most = 2000, .batch = 64, .lr_net = 5e-3, .fall = 1e-3, .w_acc = 1}};
    struct motion d;
    struct model m[2], plain;
    double samples = 0;
    if (!CHECK(motion_simulate(&d, TRUTH_PEND2_ACT, TRUTH_TRAIN, 0, 4, 1, NULL) == 0)) return;
    if (!CHECK(model_init(&plain, &test2_kind, 1, &d, 1) == 0)) return;
    struct newton_task *task = model_task(&plain, &d, &s, &samples);
    const double start = size_of_rows(task, plain.theta);
    for (int k = 0; k < 2; k++) {
        if (!CHECK(model_init(&m[k], &test2_kind, 1, &d, 1) == 0)) return;
        CHECK(model_train(&m[k], &d, &s, 1e9, 1, &samples) == 0);
        const double once = size_of_rows(task, m[k].theta);
        CHECK_BELOW(once, start / 10);
        CHECK(model_train(&m[k], &d, &s, 1e9, 2, &samples) == 0);
        CHECK_BELOW(size_of_rows(task, m[k].theta), once / 1.5);
        model_finish(&m[k]);
    }
    CHECK(memcmp(m[0].theta, m[1].theta, (size_t)m[0].kind->params * sizeof(roln_real)) == 0);
    const double c = newton_balance(task, &s, m[0].theta, 3);
    CHECK(c > 0 && c != 1);
    for (size_t k = 0; k < sizeof others / sizeof *others; k++) {
        memcpy(m[1].theta, plain.theta, (size_t)plain.kind->params * sizeof(roln_real));
        CHECK(model_train(&m[1], &d, &others[k], 1e9, 1, &samples) == 0);
        CHECK_BELOW(size_of_rows(task, m[1].theta), start / 2);
    }
    struct edge edge = {{&edge, edge_draw, edge_rows, NULL}, task, plain.theta, plain.kind->params, 0};
    struct newton *n = newton_new(plain.kind->blocks, plain.kind->table, s.batch);
    memcpy(m[1].theta, plain.theta, (size_t)plain.kind->params * sizeof(roln_real));
    fprintf(stderr, "a refusal is to follow:\n");
    CHECK(newton_run(n, &edge.task, &s, m[1].theta, 1e9, 1) == -1);
    CHECK(memcmp(m[1].theta, plain.theta, (size_t)plain.kind->params * sizeof(roln_real)) == 0);
    newton_free(n), n = newton_new(plain.kind->blocks, plain.kind->table, s.batch);
    edge.holes = 7; /* a row in seven has none: the others do */
    CHECK(newton_run(n, &edge.task, &s, m[1].theta, 1e9, 1) >= 0);
    CHECK_BELOW(size_of_rows(task, m[1].theta), start / 3);
    newton_free(n), model_task_free(task), model_free(&m[0]), model_free(&m[1]), model_free(&plain), motion_free(&d);
}

/* Polynomials without forces: the last row of a step holds the scale of M, which a ridge would lower; a short stage lowers the
   residual fourfold and leaves the scale of M near 1, within a factor e. The row weighs its logarithm by 10. */
static void test_polynomials(void)
{
    const struct stage fit = {.kind = STAGE_CHART, .batch = 0}, few = {.kind = STAGE_NEWTON, .batch = 12, .steps = 4, .stride = 5},
                       s = {.kind = STAGE_NEWTON, .most = 60, .batch = 300};
    struct motion d;
    struct model m;
    double samples = 0;
    roln_real held = 1;
    if (!CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TRAIN, 0, 4, 0, NULL) == 0) ||
        !CHECK(model_init(&m, &test16_poly_kind, 1, &d, 3) == 0) || !CHECK(model_train(&m, &d, &fit, 1e9, 1, &samples) == 0))
        return;
    const int front = m.kind->front;
    struct newton_task *task = model_task(&m, &d, &few, &samples);
    check_rows(task, m.kind->params - front, m.theta + front, 0);
    model_task_free(task);
    task = model_task(&m, &d, &s, &samples);
    CHECK(task->ridge && task->ridge[0] == 0 && roln_dot(m.kind->params - front, task->ridge, task->ridge) > 0);
    const double start = size_of_rows(task, m.theta + front);
    CHECK(model_train(&m, &d, &s, 1e9, 1, &samples) == 0);
    CHECK_BELOW(size_of_rows(task, m.theta + front), start / 4);
    m.kind->hold(m.self, NULL, &held);
    CHECK_BELOW(fabs((double)held), 10);
    model_task_free(task), model_free(&m), motion_free(&d);
}

/* `value` of the line `key argument value`; -1: there is none. */
static double find(FILE *f, const char *key, const char *argument)
{
    char k[32], a[32];
    double v, value = -1;
    rewind(f);
    while (fscanf(f, "%31s %31s %lf", k, a, &v) == 3)
        if (strcmp(k, key) == 0 && strcmp(a, argument) == 0) value = v;
    return value;
}

/* measure against NAME_errors, an independent route, and against sums by hand. */
static void test_measure(void)
{
    static const int ms[] = {0, 25, 100};
    struct model m;
    struct motion d;
    int start[400], count = 0;
    roln_error e[4];
    FILE *f = tmpfile();
    if (!CHECK(model_load(&m, &test_pend16_kind, "tests/mujoco/models/pend16.roln") == 0) || !f ||
        !CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TEST, 0, 3, 0, NULL) == 0))
        return;
    const struct predictor p = model_predictor(&m);
    CHECK(measure(&p, &d, ms, 3, f) == 0);
    for (int k = 0; k < d.count; k++)
        for (int i = 0; i + 25 < d.samples; i += 25)
            start[count++] = k * d.samples + i;
    const roln_batch b = {.count = count, .steps = 25, .stride = 1, .start = start, .q = d.q, .qd = d.qd};
    CHECK(m.kind->errors(m.self, &b, 1e-3, 25, d.mean, e) == ROLN_OK);
    CHECK_NEAR(find(f, "E_q", "25"), 100 * sqrt((double)(e[1].q / e[1].q_var)), 1e-3);
    CHECK_NEAR(find(f, "E_qd", "25"), 100 * sqrt((double)(e[1].qd / e[1].qd_var)), 1e-3);
    { /* how many windows stay below */
        int below_half = 0, below_most = 0;
        const double half = find(f, "E_q_median", "25"), most = find(f, "E_q_90", "25");
        for (int k = 0; k < count; k++) {
            roln_batch one = b;
            one.count = 1, one.start = start + k;
            CHECK(m.kind->errors(m.self, &one, 1e-3, 25, d.mean, e + 2) == ROLN_OK);
            const double x = 100 * sqrt((double)e[3].q / (double)(e[1].q_var / count));
            below_half += x <= 1.001 * half, below_most += x <= 1.001 * most;
        }
        CHECK(abs(2 * below_half - count) <= 2 && abs(10 * below_most - 9 * count) <= 20 && half < most);
        CHECK(find(f, "E_q_median", "whole") > 0 && find(f, "E_q_90", "whole") >= find(f, "E_q_median", "whole"));
    }
    CHECK(find(f, "E_q", "0") > 0 && find(f, "E_q", "0") < find(f, "E_q", "25") && find(f, "E_q", "100") > find(f, "E_q", "25"));
    CHECK_BELOW(find(f, "drift", "own"), .01);
    CHECK_BELOW(find(f, "drift", "own"), find(f, "drift", "true"));
    CHECK(find(f, "failed", "25") == -1 && find(f, "us", "step") > 0 && find(f, "trivial", "25") > find(f, "E_q", "25"));
    fclose(f), motion_free(&d), model_free(&m);
}

/* Every run has a recipe, no two recipes one name; its models have its sizes; its stages share its seconds; the budget of all. */
static void test_recipes(void)
{
    double all = 0;
    int seed;
    for (int i = 0; i < recipes_count; i++) {
        char run[64];
        snprintf(run, sizeof run, "%s-%d", recipes[i].name, recipes[i].seeds);
        CHECK(recipe_of_run(run, &seed) == &recipes[i] && seed == recipes[i].seeds);
        snprintf(run, sizeof run, "%s-%d", recipes[i].name, recipes[i].seeds + 1);
        CHECK(recipe_of_run(run, &seed) == NULL);
        const struct recipe *e = &recipes[i];
        const int dof = truth_dof(e->system);
        if (e->model)
            CHECK(strncmp(e->model->name, e->config, strlen(e->config)) == 0 && e->model->N == (e->pod > 0 ? e->pod : dof));
        if (e->whole) CHECK(e->model && e->pod > 0 && e->whole->N == dof && e->whole->n == e->model->n);
        double part = 0;
        for (int k = 0; k < STAGES; k++)
            part += recipes[i].stage[k].part;
        CHECK_NEAR(part, recipes[i].seconds > 0 && recipes[i].stage[0].part > 0, 1e-9);
        all += recipes[i].seeds * (part > 0 ? recipes[i].seconds : 0);
    }
    CHECK_BELOW(all, 6.6 * 3600);
}

/* Committed weights: bounds in percent of E_q at 25 ms, at 1 s (0: no windows of that length) and of whole trajectories. */
static const struct {
    const char *weights, *recipe;
    double near, far, whole;
} headline[] = {
    {"pend2-exp-1", "pend2-exp", .002, .5, .8},
    {"pend16-ro-1", "pend16-ro", .1, 8, 20},
    {"wave16-ro-1", "wave16-ro", .15, 12, 15},
    {"pend16-acc-1", "pend16-paper", .5, 25, 35},
    {"rope-n10-1", "rope-n10", .3, 0, 3},
    {"cloth-n10-1", "cloth-n10", .5, 0, 1},
    {"cloth-free-n10-1", "cloth-free-n10", .4, 0, .6},
    {"cloth-free-layers-1", "cloth-free-paper", .6, 0, 1},
};

/* The model with its autoencoder stored for flash: one row of a table, with bounds in percent. The range for which it is rounded
   is that of three training trajectories. */
static void stored(const struct recipe *e, const struct model *m, const struct motion *d, const struct config *kind, double near,
                   double whole)
{
    static const int ms[] = {0, 25};
    struct model s;
    struct motion train;
    FILE *f = tmpfile();
    if (!CHECK(f) || !CHECK(motion_simulate(&train, e->system, TRUTH_TRAIN, 0, 3, e->force, NULL) == 0)) return;
    CHECK(m->kind->range(m->self, train.count * train.samples, train.q, train.qd) == ROLN_OK);
    if (CHECK(model_quantise(&s, kind, m) == ROLN_OK)) {
        const struct predictor p = model_predictor(&s);
        CHECK(measure(&p, d, ms, 2, f) == 0);
        printf("  stored %s %6d bytes of flash, autoencoder %6d; E_q 0 ms %.3f, 25 ms %.3f, whole %.3f\n",
               kind->md->ae.storage->bits == 8 ? "int8" : "half",
               (int)sizeof(roln_real) * ROLN_NUMBERS(0, kind->n, kind->params), (int)sizeof(roln_real) * kind->front,
               find(f, "E_q", "0"), find(f, "E_q", "25"), find(f, "E_q", "whole"));
        CHECK_BELOW(find(f, "E_q", "25"), near);
        CHECK_BELOW(find(f, "E_q", "whole"), whole);
    }
    fclose(f), model_free(&s), motion_free(&train);
}

static void test_headline(void)
{
    static const int ms[] = {0, 25, 100, 1000};
    for (size_t i = 0; i < sizeof headline / sizeof *headline; i++) {
        const struct recipe *e = recipe_of(headline[i].recipe);
        struct model m;
        struct motion d;
        char path[128];
        FILE *f = tmpfile();
        if (!CHECK(e && f && recipe_weights(e))) return;
        snprintf(path, sizeof path, "tests/experiments/weights/%s.roln", headline[i].weights);
        if (!CHECK(model_load(&m, recipe_weights(e), path) == 0) ||
            !CHECK(motion_simulate(&d, e->system, TRUTH_TEST, 0, TESTS, e->force, NULL) == 0))
            return;
        const struct predictor p = model_predictor(&m);
        CHECK(measure(&p, &d, ms, 4, f) == 0);
        printf("%-16s E_q 0 ms %.3f, 25 ms %.3f, 100 ms %.3f, ", headline[i].weights, find(f, "E_q", "0"), find(f, "E_q", "25"),
               find(f, "E_q", "100"));
        if (headline[i].far > 0)
            printf("1 s %.2f (median window %.2f, 90 %% %.2f), ", find(f, "E_q", "1000"), find(f, "E_q_median", "1000"),
                   find(f, "E_q_90", "1000"));
        else
            printf("its median window %.3f, 90 %% %.3f, ", find(f, "E_q_median", "100"), find(f, "E_q_90", "100"));
        printf("whole %.3f, E_qd 25 ms %.2f %%; q + h qd at 25 ms %.2f %%\n", find(f, "E_q", "whole"), find(f, "E_qd", "25"),
               find(f, "trivial", "25"));
        CHECK_BELOW(find(f, "E_q", "25"), headline[i].near);
        CHECK_BELOW(find(f, "E_q", "whole"), headline[i].whole);
        if (headline[i].far > 0) CHECK_BELOW(find(f, "E_q", "1000"), headline[i].far);
        if (strcmp(headline[i].weights, "cloth-free-layers-1") == 0) {
            printf("  stored full %6d bytes of flash, autoencoder %6d\n",
                   (int)sizeof(roln_real) * ROLN_NUMBERS(0, m.kind->n, m.kind->params),
                   (int)sizeof(roln_real) * m.kind->front);
            stored(e, &m, &d, &cloth_free_half_kind, .6, 1);
            stored(e, &m, &d, &cloth_free_int8_kind, 1.3, 1.5);
        }
        fclose(f), motion_free(&d), model_free(&m);
    }
}

int main(void)
{
    test_recipes();
    test_compose();
    test_chart();
    test_rows();
    test_newton();
    test_polynomials();
    test_measure();
    test_headline();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
