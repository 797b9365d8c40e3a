/* SPDX-License-Identifier: MIT */
/* Rows of residuals for Gauss-Newton (NAME_rows): against differences of the residuals (double) or against those in double (float);
   the same bits in every way to ask for them; their means over all signs are the loss and its gradient; statuses. */

/* Rows of every model by its networks alone, */
#define CALLED(X) X(rows)
#define SMALL(name) tail_##name
#define SMALL_ROWS 3
#define EVERY_LEARN networks
#include "small_models.h"
#undef EVERY_LEARN

/* and by everything. */
#undef CALLED
#define CALLED(X) X(rows) X(grad) X(grad_acc)
#define SMALL(name) full_##name
#define SMALL_ROWS 3
#define EVERY_LEARN everything
#include "small_models.h"
#undef EVERY_LEARN

#undef CALLED
#define CALLED(X)
#include "small.h"

#define TAIL(name) tail_##name##_called
#define FULL(name) full_##name##_called
static const model *const tails[MODELS] = SMALL_TABLE(TAIL, TAIL), *const fulls[MODELS] = SMALL_TABLE(FULL, FULL);

#include "samples.h"

void TEST_NAME(rows)(void);

enum { ROWS = 3 };

/* Residuals r [ROWS] and, unless J is NULL, their rows J [ROWS][..], of the loss of the weights and of the windows of b. */
static roln_status rows_of(const instance *m, const roln_loss *wt, const data *d, uint64_t seed, roln_real *J, roln_real *r)
{
    const scratch_sizes *room_for = &m->of->scratch;
    const int acc = d->b.qdd != NULL && d->b.steps == 0;
    const roln_status st = m->of->rows(m, wt, &d->b, d->h, seed, J, r, room_of(acc ? room_for->grad_acc : room_for->grad));
    ROOM_KEPT();
    return st;
}

/* A model, two windows of a kind, the second of them again where windows may be listed, their rows and residuals. tail: the same
   numbers, of which the networks alone learn. */
typedef struct {
    int k, kind, params, count;
    roln_real theta[MAXP], J[ROWS * MAXP], r[ROWS];
    instance m, tail;
    data d;
} subject;

static void make_rows(int k, int kind, subject *x)
{
    uint64_t s = (uint64_t)(1000 + 10 * k + kind);
    x->k = k, x->kind = kind, x->params = models[k]->params;
    x->m = trained(fulls[k], scale_of(k), x->theta), x->tail = trained(tails[k], scale_of(k), x->theta);
    parameters(k, &s, x->theta);
    make(k, kind, 2, &s, &x->d);
    if (x->d.b.start) x->d.b.count = 3, x->d.start[2] = x->d.start[1];
    x->count = x->d.b.count;
    fill(ROWS * MAXP, 7, x->J), fill(ROWS, 7, x->r);
    CHECK_OK(rows_of(&x->m, &weights.loss, &x->d, 40, x->J, x->r));
}

void test_rows_reference(int k, int kind, double *J, double *r);
#ifdef ROLN_DOUBLE
void test_rows_reference(int k, int kind, double *J, double *r)
{
    static subject x;
    make_rows(k, kind, &x);
    memcpy(J, x.J, sizeof x.J), memcpy(r, x.r, sizeof x.r);
}

/* In parts of the largest number of its row, so that what is compared is of order one. */
static double minus_residual(void *ctx)
{
    const subject *x = (const subject *)ctx;
    roln_real r[ROWS];
    CHECK_OK(rows_of(&x->m, &weights.loss, &x->d, 40, NULL, r));
    return -r[0] / (double)largest(x->params, x->J);
}

/* Every row by central differences of -r in every parameter, in kinds other than ODE every third; the first also with half the
   step. */
static void check_rows_slope(subject *x)
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
            x->theta[i] = x->theta[j] = was + move[p];
            CHECK_OK(rows_of(&x->m, &weights.loss, &x->d, 40, NULL, v[p]));
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
    if (i == x->params && x->kind % 2 == 0 && x->k != RUBBED) /* whose |g| and |y| have kinks: test_lnn.c stays away from them */
        check_halving(x->params, row, x->theta, 1e-3, minus_residual, x);
}
#else
/* Every row against that in double; a residual is a sum of errors of either sign, which the loss adds as squares. */
static void check_rows_slope(const subject *x)
{
    static double J[ROWS * MAXP], r[ROWS];
    const ld amp = is_var(x->kind) ? (ld)scale.t / (ld)x->d.h : 1;
    static gradient g;
    ld size;
    int i, w;
    test_rows_reference(x->k, x->kind, J, r);
    CHECK_OK(grad_of(&x->m, &x->d, &g));
    size = sqrtl((ld)weighted(&g.t));
    for (w = 0; w < x->count; w++) {
        const roln_real *row = x->J + w * x->params;
        BOUND("residuals, eps", fabsl((ld)x->r[w] - (ld)r[w]) / (size * EPS), 30 * amp);
        for (i = 0; i < x->params; i++)
            BOUND("rows, eps", fabsl((ld)row[i] - (ld)J[w * x->params + i]) / (largest(x->params, row) * EPS), 160 * amp);
    }
}
#endif

/* The same bits: residuals alone, the rows of the networks alone, one window at a time; others for other signs. */
static void check_rows_bits(const subject *x)
{
    static roln_real J[ROWS * MAXP], tail[ROWS * MAXP];
    static data one;
    roln_real r[ROWS];
    const int P = x->params, ae = roln_ae_params(&models[x->k]->md->ae), rest = P - ae, count = x->count;
    int behind, w;
    fill(ROWS, 7, r);
    CHECK_OK(rows_of(&x->m, &weights.loss, &x->d, 40, NULL, r));
    CHECK(same(count, r, x->r) && all(ROWS - count, r + count, 7));
    CHECK(all((ROWS - count) * P, x->J + count * P, 7)); /* nothing behind the last row */
    for (behind = 0; behind < 2; behind++) {
        fill(ROWS, 7, r), fill(ROWS * MAXP, 7, tail);
        CHECK_OK(rows_of(behind ? &x->tail : &x->m, &weights.loss, &x->d, 40, behind ? tail : J, r));
        CHECK(same(count, r, x->r));
    }
    CHECK(same(count * P, J, x->J) && all(ROWS * MAXP - count * rest, tail + count * rest, 7));
    for (w = 0; w < count; w++) {
        CHECK(same(rest, tail + w * rest, x->J + w * P + ae));
        some_windows(&x->d, w, 1, &one);
        CHECK_OK(rows_of(&x->m, &weights.loss, &one, 40 + (uint64_t)w, J, r));
        CHECK(same(1, r, x->r + w) && same(P, J, x->J + w * P));
        CHECK_OK(rows_of(&x->m, &weights.loss, &one, 90, J, r));
        CHECK(!same(P, J, x->J + w * P));
    }
    if (count == 3) CHECK(!same(P, x->J + P, x->J + 2 * P)); /* the same window */
}

/* Parameters and data are as they were; no window, no row. */
static void check_rows_kept(const subject *x)
{
    static subject again;
    static roln_real J[ROWS * MAXP];
    roln_real r[ROWS];
    uint64_t s = (uint64_t)(1000 + 10 * x->k + x->kind);
    data *d = &again.d;
    parameters(x->k, &s, again.theta);
    make(x->k, x->kind, 2, &s, d);
    CHECK(same(x->params, x->theta, again.theta) && same(MAXD, x->d.q, d->q) && same(MAXD, x->d.qd, d->qd));
    CHECK(same(MAXD, x->d.qdd, d->qdd) && same(MAXD, x->d.tau, d->tau));
    d->b.count = 0, fill(ROWS, 7, r), fill(ROWS * MAXP, 7, J);
    CHECK_OK(rows_of(&x->m, &weights.loss, d, 40, J, r));
    CHECK(all(ROWS, r, 7) && all(ROWS * MAXP, J, 7));
}

/* A window that fails: its status, an infinite residual, those before it as they are. Arguments that are none. */
static void check_rows_status(subject *x)
{
    static roln_real J[ROWS * MAXP];
    const int N = N_OF(x->k), length = x->d.b.steps * x->d.b.stride + 1, P = x->params;
    roln_real r[ROWS], *const fields[4] = {x->d.q, x->d.qd, x->d.qdd, x->d.tau};
    const int skip[4] = {0, is_var(x->kind), !is_acc(x->kind), x->d.b.tau == NULL};
    const roln_batch b = x->d.b;
    int f, i;
    x->d.b.start = NULL, x->d.b.count = 2;
    for (f = 0; f < 4; f++)
        for (i = 0; i < 4 && !skip[f]; i++) {
            const int size = f == 3 ? F_OF(x->k) : N;
            roln_real *at = fields[f] + length * size + i % size, was = *at;
            *at = (roln_real)(i % 2 ? NAN : INFINITY);
            fill(ROWS, 7, r);
            CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, i < 2 ? J : NULL, r) == ROLN_E_NOT_FINITE);
            CHECK(roln_finite(r[0]) && !all(1, r, 7) && !roln_finite(r[1]) && all(ROWS - 2, r + 2, 7));
            *at = was;
        }
    fill(ROWS, 7, r), fill(ROWS * MAXP, 7, J);
    for (i = 0; i < P; i += 1 + P / 20) {
        const roln_real was = x->theta[i];
        x->theta[i] = (roln_real)NAN;
        CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, J, r) == ROLN_E_NOT_FINITE);
        x->theta[i] = was;
    }
    x->d.b.count = -1;
    CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, J, r) == ROLN_E_LENGTH);
    x->d.b.count = 1, x->d.b.stride = 0;
    CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, J, r) == ROLN_E_LENGTH);
    x->d.b.stride = 1, x->d.b.steps = -1;
    CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, J, r) == ROLN_E_LENGTH);
    x->d.b.steps = 1 - is_acc(x->kind), x->d.b.qd = NULL; /* the acceleration loss needs them; others two steps of positions */
    CHECK(rows_of(&x->m, &weights.loss, &x->d, 40, J, r) == ROLN_E_LENGTH);
    CHECK(all(ROWS, r, 7) && all(ROWS * MAXP, J, 7));
    x->d.b = b;
}

/* The loss and -1/2 of its gradient are the means of r^2 and r J over all signs: over all patterns of the few signs of one term,
   each found by drawing, exactly. K numbers are compared. */
enum { MOST = 6, PATTERNS = 1 << MOST };
static void check_patterns(const subject *x, int term, int K)
{
    static roln_real row[ROWS * MAXP], r[ROWS];
    static ld mean[MAXP];
    static uint64_t seen[PATTERNS];
    static gradient g;
    terms wt = {0};
    uint64_t seed;
    ld loss = 0, want, top, amp = is_var(x->kind) ? (ld)scale.t / (ld)x->d.h : 1;
    int found = 0, i;
    wt.term[term] = weights.term[term];
    memset(&g, 0, sizeof g), memset(mean, 0, sizeof mean);
    CHECK_OK(add_grad(&x->m, &wt.loss, &x->d, &g));
    want = (ld)wt.term[term] * (ld)g.t.term[term], top = largest(x->params, g.theta) + 1e-30L;
    for (seed = 1; seed < 20u << K && found < 1 << K; seed++) {
        uint64_t mark;
        CHECK_OK(rows_of(&x->m, &wt.loss, &x->d, seed, row, r));
        mark = roln_fnv((int)((size_t)x->params * sizeof *row), (const unsigned char *)row, ROLN_FNV);
        for (i = 0; i < found && seen[i] != mark; i++) {}
        if (i < found) continue;
        seen[found++] = mark;
        loss += (ld)r[0] * (ld)r[0] / (1 << K);
        for (i = 0; i < x->params; i++)
            mean[i] += (ld)r[0] * (ld)row[i] / (1 << K);
    }
    CHECK(found == 1 << K);
    BOUND("mean of r^2, eps", fabsl(loss - want) / (want * EPS + 1e-30L), 6);
    for (i = 0; i < x->params; i++)
        BOUND("mean of r J, eps", fabsl(2 * mean[i] + (ld)g.theta[i]) / (top * EPS), 60 * amp);
}

static void check_all_patterns(const subject *x)
{
    static subject one;
    const int N = N_OF(x->k), n = n_OF(x->k), H = is_acc(x->kind) ? 0 : 1 + is_var(x->kind), ahead = is_var(x->kind) ? 1 : H;
    const int bent = models[x->k]->md->ae.layers > 0;
    int term;
    one = *x, one.m.theta = one.tail.theta = one.theta;
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
static void check_means(const subject *x, int draws)
{
    static roln_real row[ROWS * MAXP], r[ROWS];
    static ld mean[MAXP], square[MAXP];
    static gradient g;
    static data d;
    ld loss = 0, want, along = 0, size = 0;
    int i, k;
    some_windows(&x->d, 0, 1, &d);
    CHECK_OK(grad_of(&x->m, &d, &g));
    want = (ld)weighted(&g.t);
    memset(mean, 0, sizeof mean), memset(square, 0, sizeof square);
    for (k = 0; k < draws; k++) {
        CHECK_OK(rows_of(&x->m, &weights.loss, &d, (uint64_t)k, row, r));
        loss += (ld)r[0] * (ld)r[0] / draws;
        for (i = 0; i < x->params; i++) {
            const ld y = (ld)r[0] * (ld)row[i];
            mean[i] += y / draws, square[i] += y * y / draws;
        }
    }
    BOUND("mean of r^2, standard errors", fabsl(loss - want) / (want * sqrtl(2.0L / draws)), 5); /* E r^4 <= 3 (E r^2)^2 */
    for (i = 0; i < x->params; i++) {
        const ld error = sqrtl((square[i] - mean[i] * mean[i]) / draws);
        BOUND("mean of r J, standard errors", fabsl(mean[i] + (ld)g.theta[i] / 2) / (error + 1e-30L), 5);
        along -= 2 * mean[i] * (ld)g.theta[i], size += (ld)g.theta[i] * (ld)g.theta[i];
    }
    CHECK_NEAR(along / size, 1, 0.2);
}

static void test_model(int k, int kind)
{
    static subject x;
    make_rows(k, kind, &x);
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
    const roln_gradient g = {NULL, NULL, NULL, NULL, &signs, &r, NULL, NULL};
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

/* Rows whose forces are divided by their deviation. The row with variances v of two coordinates is A / sqrt(v_0) + B / sqrt(v_1): A
   and B follow from powers of two, exactly; then any v. Units six decades apart: the small one is nearly all of the row. */
enum { FORCES = full_plain_newton_size };

typedef struct {
    full_plain_params p;
    full_plain_residuals g;
    full_plain_rows_work w;
    data d;
} force_rows;

/* The row and, behind it, the residual, with variances a, b. */
static void row_of_forces(force_rows *x, double a, double b, double *row)
{
    const roln_loss force = {.force = 4};
    int i;
    x->g.seed = 9, x->g.force_variance[0] = (roln_real)a, x->g.force_variance[1] = (roln_real)b;
    CHECK_OK(full_plain_rows(&x->p, &force, &x->d.b, x->d.h, 0, 0, &x->g, &x->w));
    for (i = 0; i < FORCES; i++)
        row[i] = (double)x->g.J[i];
    row[FORCES] = (double)x->g.r[0];
}

static void test_force_rows(void)
{
    static force_rows x;
    static double plain[FORCES + 1], one[FORCES + 1], half[FORCES + 1], got[FORCES + 1], up[FORCES + 1], down[FORCES + 1];
    static const double v[5][2] = {{2, 3}, {1e-6, 1}, {1, 1e-6}, {1e6, 1e-6}, {1e-6, 1e6}};
    uint64_t s = 77;
    double top;
    int k, i;
    CHECK(full_plain_n == 2);
    memset(&x.p, 0, sizeof x.p);
    x.p.slope = full_plain_model.ae.slope, x.p.eigenvalue_floor = full_plain_model.lnn.eigenvalue_floor, x.p.scale = scale;
    parameters(PLAIN, &s, x.p.theta);
    make(PLAIN, ACC, 1, &s, &x.d);
    row_of_forces(&x, 0, 0, plain), row_of_forces(&x, 1, 1, one), row_of_forces(&x, 4, 1, half);
    CHECK(memcmp(plain, one, sizeof one) == 0); /* a variance of 1 is none, to the bit */
    for (k = 0; k < 5; k++) {
        row_of_forces(&x, v[k][0], v[k][1], got);
        for (i = 0, top = 0; i < FORCES; i++)
            top = fmax(top, fabs(got[i]));
        for (i = 0; i <= FORCES; i++) {
            const double A = 2 * (one[i] - half[i]), B = one[i] - A, want = A / sqrt(v[k][0]) + B / sqrt(v[k][1]);
            BOUND("rows of forces, eps", fabs(got[i] - want) / ((i < FORCES ? top : fabs(got[i])) * (double)EPS), 20);
        }
        for (i = 0; i < FORCES && EPS < 1e-10; i++) { /* central differences, in double */
            const roln_real was = x.p.theta[i], h = ROLN_C(1e-5);
            if (mate(PLAIN, i) != i) continue;
            x.p.theta[i] = was + h, row_of_forces(&x, v[k][0], v[k][1], up);
            x.p.theta[i] = was - h, row_of_forces(&x, v[k][0], v[k][1], down);
            x.p.theta[i] = was;
            BOUND("rows of forces, differences", fabs(got[i] + (up[FORCES] - down[FORCES]) / (2 * (double)h)) / top, 1e-8);
        }
    }
}

void TEST_NAME(rows)(void)
{
    int k, kind;
    for (k = 0; k < MODELS; k++)
        for (kind = 0; kind < KINDS; kind++)
            test_model(k, kind);
    test_signs();
    test_force_rows();
    print_bounds();
}
