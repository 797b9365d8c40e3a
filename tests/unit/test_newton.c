/* SPDX-License-Identifier: MIT */
/* Riemannian Gauss-Newton (roln_riem.h, section 7): a step against a dense solution of its definition in long double, on tables of
   every manifold; problems with a known end; what must fail or be refused, and leave everything as it was. Of a model:
   test_newton_model.c; rows of residuals: test_rows.c. */
#include "roln_riem.h"
#include "manifolds.h"
#include "room.h"

void TEST_NAME(newton)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* ---- problems --------------------------------------------------------------------------------- */

enum { MAXR = 400, MAXP = 200 };

/* A table of more parameters than a block of sums has terms, so that a system in the rows sums over more than that, too. */
enum { WIDE_SIZE = 130 + 48 + 9 + 4 };
static const roln_block wide[] = {{&roln_biorthogonal, 3, 8, 0}, {ROLN_EUCLIDEAN, 1, 130, 0}, {&mode, 0, 4, 0},
                                  {&roln_spd, 3, 3, 0},
                                  {&sphere, 1, 4, 0}};
/* Numbers without a constraint, in three blocks and in one. */
static const roln_block flat[] = {{ROLN_EUCLIDEAN, 2, 3, 0}, {&roln_spd, 0, 0, 0}, {ROLN_EUCLIDEAN, 6, 1, 0}};
static const roln_block line[] = {{ROLN_EUCLIDEAN, 4, 10, 0}};
/* One of each, small. */
enum { FEW_SIZE = 4 + 16 + 4 + 2 };
static const roln_block few[] = {{&sphere, 1, 4, 0}, {&roln_biorthogonal, 2, 4, 0}, {&roln_spd, 2, 2, 0},
                                 {ROLN_EUCLIDEAN, 2, 1, 0}};
#define TABLE(t) t, (int)(sizeof t / sizeof *t)

typedef struct {
    const roln_block *table;
    int blocks, R, P, side;
    roln_newton_opt opt;
    roln_newton state;
    roln_real x[MAXP], J[(MAXR + 1) * MAXP], r[MAXR], S[MAXP * (MAXP + 1)];
    roln_real weight[MAXR], expect[MAXR], next[MAXP], keep[MAXP];
} problem;

static void problem_of(const roln_block *t, int blocks, int R, problem *g)
{
    const roln_newton_opt opt = {1, 1, 0, NULL};
    const roln_newton start = ROLN_NEWTON_START;
    memset(g, 0, sizeof *g);
    g->table = t, g->blocks = blocks, g->R = R, g->P = roln_product_size(blocks, t), g->side = ROLN_NEWTON_SIDE(R, g->P);
    g->opt = opt, g->state = start;
    CHECK(R <= MAXR && g->P <= MAXP);
}

/* A random point on the manifolds of a table. */
static void random_point(const problem *g, uint64_t *s, roln_real *x)
{
    int b;
    for (b = 0; b < g->blocks; x += roln_block_size(g->table + b), b++) {
        const roln_block *t = g->table + b;
        const int size = roln_block_size(t);
        roln_real norm;
        fill(size, 1, s, x);
        if (t->manifold == &roln_biorthogonal && size > 0) point(t->rows, t->cols, 0, s, x);
        if (t->manifold == &roln_spd && size > 0) random_spd(t->rows, s, x);
        if (t->manifold == &roln_stiefel && size > 0) CHECK_OK(roln_stiefel_init(t->rows, t->cols, x, s, room_of(MNN)));
        if (t->manifold == &sphere && size > 0) norm = ROLN_SQRT(roln_dot(size, x, x)), shorten(size, norm, x);
    }
}

/* Random rows and residuals, some of them ten times as large. */
static void random_rows(problem *g, uint64_t *s)
{
    int k;
    fill(g->R * g->P, 1, s, g->J);
    for (k = 0; k < g->R; k++) fill(1, k % 7 == 3 ? 0.1L : 0.01L, s, g->r + k);
}

/* Something to carry, as if from steps before; symmetric in the frame of a matrix. */
static void random_carried(problem *g, uint64_t *s)
{
    roln_real *carried = g->J + g->R * g->P;
    int b, i;
    fill(g->P, 0.005L, s, carried);
    for (b = 0; b < g->blocks; carried += roln_block_size(g->table + b), b++) {
        const int n = g->table[b].rows;
        for (i = 0; i < n * n && g->table[b].manifold == &roln_spd; i++) carried[i] = carried[i % n * n + i / n];
    }
}

/* The largest work of a verb. */
static int verb_of(const problem *g)
{
    int b, verb = 0;
    for (b = 0; b < g->blocks; b++) {
        const roln_block *t = g->table + b;
        if (t->manifold != ROLN_EUCLIDEAN && roln_block_size(t) > 0) verb = ROLN_MAX(verb, t->manifold->work(t->rows, t->cols));
    }
    return verb;
}

static roln_status rows(problem *g)
{
    const roln_status st =
        roln_newton_rows(g->blocks, g->table, &g->opt, g->R, g->x, g->J, g->r, g->weight, &g->state, room_of(verb_of(g)));
    CHECK_BELOW(room_used(), room_end);
    return st;
}

static void sums(problem *g)
{
    roln_newton_normal_equations(&g->opt, g->R, g->P, 0, g->side, g->J, g->S, room_of(ROLN_SYM_WORK));
    CHECK_BELOW(room_used(), room_end);
}

static roln_status step(problem *g)
{
    const roln_newton_system system = {g->R, g->P, g->J, g->r, g->S};
    const roln_status st = roln_newton_step(g->blocks, g->table, &g->opt, &system, g->x, &g->state, g->next, g->expect, g->keep,
                                            room_of(ROLN_NEWTON_STEP_WORK(g->R, g->P, verb_of(g))));
    CHECK_BELOW(room_used(), room_end);
    return st;
}

/* The step is taken, or not. */
static void end_step(problem *g, int taken)
{
    roln_real *carried = g->J + g->R * g->P;
    if (taken) memcpy(g->x, g->next, sizeof g->x), memcpy(carried, g->keep, (size_t)g->P * sizeof *carried);
    else if (g->side < g->P) memset(carried, 0, (size_t)g->P * sizeof *carried);
}

/* The triangle of sums, without that of their factor. */
static int same_sums(const problem *g, const roln_real *S)
{
    int i, ok = 1;
    for (i = 0; i < g->side; i++) ok &= same(i + 1, g->S + i * (g->side + 1), S + i * (g->side + 1));
    return ok;
}

/* ---- the twin --------------------------------------------------------------------------------- */

typedef struct {
    ld J[(MAXR + 1) * MAXP], r[MAXR], weight[MAXR], size[MAXR + 1]; /* size: of a row before it was projected */
    ld A[MAXP * MAXP];                                              /* sums of all rows, faded, from step to step */
    ld next[MAXP], expect[MAXR], keep[MAXP], length, trace, condition;
    int capped;
} twin;

/* The Riemannian gradient of u at x in the coordinates of the manifold; carried: u is a tangent. */
static void t_tangent(const roln_block *b, const ld *x, int carried, ld *u)
{
    const int n = b->rows, N = b->cols;
    ld A[MNN], B[MNN], G[MNN];
    int i;
    if (b->manifold == &roln_biorthogonal) t_project(n, N, x, u);
    if (b->manifold == &roln_stiefel || b->manifold == &sphere) t_stiefel_project(n, N, x, u);
    if (b->manifold != &roln_spd || carried) return;
    t_chol(n, x, A); /* A^T sym(u) A */
    for (i = 0; i < n * n; i++) B[i] = A[i % n * n + i / n], G[i] = (u[i] + u[i % n * n + i / n]) / 2;
    t_congruence(n, B, G, u);
}

/* y = R_x(u). */
static void t_retraction(const roln_block *b, const ld *x, const ld *u, ld *y)
{
    const int n = b->rows, N = b->cols, size = roln_block_size(b);
    ld A[MNN], U[MNN];
    int i;
    for (i = 0; i < size; i++) y[i] = x[i] + u[i];
    if (b->manifold == &roln_biorthogonal) t_retract(n, N, x, u, y);
    if (b->manifold == &roln_stiefel || b->manifold == &sphere) t_orthonormal(n, N, y);
    if (b->manifold != &roln_spd) return;
    t_chol(n, x, A);
    t_congruence(n, A, u, U);
    t_spd_retract(n, x, U, y);
}

/* Rows and residuals as roln_newton_rows makes them: the square of what is left of r has the slope of bound |r|. */
static void t_rows(const problem *g, twin *t)
{
    const int R = g->R, P = g->P;
    ld x[MAXP], bound = 0;
    int b, k, i, at = 0;
    widen(P, g->x, x), widen((R + 1) * P, g->J, t->J), widen(R, g->r, t->r);
    for (k = 0; k <= R; k++) t->size[k] = sqrtl(dot(P, t->J + k * P, t->J + k * P));
    for (b = 0; b < g->blocks; at += roln_block_size(g->table + b), b++)
        for (k = 0; k <= R && roln_block_size(g->table + b) > 0; k++) t_tangent(g->table + b, x + at, k == R, t->J + k * P + at);
    for (k = 0; k < R; k++) bound += fabsl(t->r[k]);
    bound *= (ld)g->opt.cap / R, t->capped = 0;
    for (k = 0; k < R; k++) {
        const int out = bound > 0 && fabsl(t->r[k]) > bound;
        t->weight[k] = out ? sqrtl(bound / fabsl(t->r[k])) : 1, t->capped += out;
        for (i = 0; i < P; i++) t->J[k * P + i] *= t->weight[k];
        t->r[k] *= t->weight[k];
    }
}

/* Number i of the ridge: no such row in the system of the rows. */
static ld t_ridge(const problem *g, int i)
{
    return g->opt.ridge && g->P <= 8 * g->R ? (ld)g->opt.ridge[i] : 0;
}

/* (A + s I) d = G, with all rows; of few rows d = argmin |J d - r|^2 + s |d - mu d_old|^2, where its derivative vanishes:
   (J^T J + s I) d = J^T r + s mu d_old. The direction that is gone lies in the tangent space. */
static void t_step(const problem *g, twin *t)
{
    static ld K[MAXP * MAXP];
    const int R = g->R, P = g->P, few_rows = P > 8 * R;
    const ld beta = 1 - 1 / (ld)g->opt.memory, rate = (ld)g->opt.rate, *carried = t->J + R * P;
    ld x[MAXP], u[MAXP], d[MAXP], G[MAXP], s, drawn = 0;
    int b, k, i, j, at = 0;
    widen(P, g->x, x);
    for (i = 0; i < P; i++)
        for (j = 0; j <= i; j++) {
            ld sum = few_rows ? 0 : beta * t->A[i * P + j];
            for (k = 0; k < R; k++) sum += t->J[k * P + i] * t->J[k * P + j];
            if (i == j) sum += t_ridge(g, i);
            t->A[i * P + j] = t->A[j * P + i] = sum;
        }
    memcpy(K, t->A, sizeof K);
    for (t->trace = 0, i = 0; i < P; i++) t->trace += K[i * P + i];
    s = (ld)g->state.lambda * t->trace / P, t->condition = 1 + t->trace / s;
    for (i = 0; i < P; i++) {
        G[i] = beta * carried[i] * (few_rows ? s : 1);
        for (k = 0; k < R; k++) G[i] += t->J[k * P + i] * t->r[k];
        G[i] -= t_ridge(g, i) * x[i], drawn += t_ridge(g, i) * x[i] * x[i];
        d[i] = G[i], K[i * P + i] += s;
    }
    t_solve(P, 1, K, d);
    for (i = 0; i < P; i++) t->keep[i] = few_rows ? d[i] : G[i] - rate * dot(P, t->A + i * P, d);
    t->length = sqrtl(dot(P, d, d)) + sqrtl(dot(P, carried, carried)) / (few_rows ? 1 : t->trace) +
                sqrtl((dot(R, t->r, t->r) + drawn) / t->trace);
    for (b = 0; b < g->blocks; at += roln_block_size(g->table + b), b++) {
        if (roln_block_size(g->table + b) == 0) continue;
        t_tangent(g->table + b, x + at, 1, d + at);
        for (i = at; i < at + roln_block_size(g->table + b); i++) u[i] = rate * d[i];
        t_retraction(g->table + b, x + at, u + at, t->next + at);
    }
    for (k = 0; k < R; k++) t->expect[k] = t->r[k] - dot(P, t->J + k * P, u);
}

/* ---- one step, in every way ------------------------------------------------------------------- */

static problem now, was, other;
static twin slow;

/* Rows of many are the bits of rows one by one, and what is carried without rows is that with them. */
static void check_single_rows(const problem *before, const problem *after)
{
    const int R = after->R, P = after->P;
    int k, b, at = 0;
    for (k = 0; k < R; k += 1 + R / 5) {
        problem_of(before->table, before->blocks, 1, &other);
        memcpy(other.x, before->x, sizeof other.x);
        memcpy(other.J, before->J + k * P, (size_t)P * sizeof *other.J), other.r[0] = before->r[k];
        memcpy(other.J + P, before->J + R * P, (size_t)P * sizeof *other.J);
        CHECK_OK(rows(&other));
        CHECK(same(P, other.J, after->J + k * P) && same(P, other.J + P, after->J + R * P) && same(1, other.r, after->r + k));
    }
    memcpy(other.J, before->J + R * P, (size_t)P * sizeof *other.J);
    for (b = 0; b < before->blocks; at += roln_block_size(before->table + b), b++) {
        const roln_block *t = before->table + b;
        if (t->manifold == ROLN_EUCLIDEAN || roln_block_size(t) == 0) continue;
        CHECK_OK(t->manifold->tangent(t->rows, t->cols, before->x + at, 0, P, other.J + at,
                                      room_of(t->manifold->work(t->rows, t->cols))));
    }
    CHECK(same(P, other.J, after->J + R * P));
}

static void check_rows(void)
{
    const int R = now.R, P = now.P;
    int k, i, at, b;
    was = now;
    CHECK_OK(rows(&now));
    t_rows(&was, &slow);
    for (k = 0; k <= R; k++)
        BOUND("rows, eps of their size", dist(P, now.J + k * P, slow.J + k * P) / (slow.size[k] * EPS + 1e-30L), 12);
    BOUND("residuals, eps", dist(R, now.r, slow.r) / (sqrtl(dot(R, slow.r, slow.r)) * EPS), 4);
    BOUND("weights, eps", dist(R, now.weight, slow.weight) / (sqrtl((ld)R) * EPS), 1);
    BOUND("loss, eps", fabsl((ld)now.state.loss - dot(R, slow.r, slow.r)) / (dot(R, slow.r, slow.r) * EPS), 8);
    CHECK(same(P, now.x, was.x) && now.state.lambda == was.state.lambda && now.state.error == was.state.error);
    CHECK(now.opt.cap > 0 ? slow.capped < R : slow.capped == 0);
    CHECK(!(now.opt.cap > 0) || slow.capped > 0 || now.opt.cap > 2 || R < 20);
    if (now.opt.cap > 0) return;
    for (b = at = 0; b < now.blocks; at += roln_block_size(now.table + b), b++) /* free numbers stay as they are */
        for (k = 0; k <= R && now.table[b].manifold == ROLN_EUCLIDEAN; k++)
            for (i = at; i < at + roln_block_size(now.table + b); i++) CHECK(now.J[k * P + i] == was.J[k * P + i]);
    CHECK(same(R, now.r, was.r));
    check_single_rows(&was, &now);
}

/* However they are divided, not beyond the system, and with the older rows, unless none are remembered. */
static void check_sums(int first)
{
    const int size = now.side * (now.side + 1), cut = 7 * now.side / 10;
    int i;
    for (i = first ? 0 : size; i < MAXP * (MAXP + 1); i++) now.S[i] = poison();
    for (i = 0; i < size && first && now.side == now.P && now.opt.memory > 1; i++) now.S[i] = 0;
    memcpy(other.S, now.S, sizeof other.S);
    sums(&now);
    roln_newton_normal_equations(&now.opt, now.R, now.P, cut, now.side + 3, now.J, other.S, room_of(ROLN_SYM_WORK));
    roln_newton_normal_equations(&now.opt, now.R, now.P, 0, cut, now.J, other.S, room_of(ROLN_SYM_WORK));
    CHECK(same(MAXP * (MAXP + 1), now.S, other.S));
    CHECK(unused(MAXP * (MAXP + 1) - size, now.S + size) == MAXP * (MAXP + 1) - size);
}

static void check_step(void)
{
    const int R = now.R, P = now.P;
    ld e, unit;
    CHECK(now.state.lambda > 0);
    was = now;
    CHECK_OK(step(&now));
    CHECK_ROOM();
    t_step(&was, &slow);
    e = slow.condition * slow.length * EPS, unit = now.side == P ? slow.trace : slow.condition;
    BOUND("end of the step, eps of its condition", dist(P, now.next, slow.next) / (e + 60 * EPS), 0.4);
    BOUND("residuals that are expected, eps", dist(R, now.expect, slow.expect) / (sqrtl(slow.trace) * e), 0.5);
    BOUND("what is carried on, eps", dist(P, now.keep, slow.keep) / (unit * slow.length * EPS), 0.3);
    CHECK(same(P, now.x, was.x) && same((R + 1) * P, now.J, was.J) && same(R, now.r, was.r) && same_sums(&now, was.S));
    CHECK(same(R, now.weight, was.weight) && memcmp(&now.state, &was.state, sizeof now.state) == 0);
}

/* A step again is the same; one with more damping takes the sums that are there, whatever was factored beside them. */
static void check_again(void)
{
    const int P = now.P, R = now.R, n = now.side;
    int i, j;
    other = now;
    memset(other.next, 0, sizeof other.next), memset(other.expect, 0, sizeof other.expect);
    memset(other.keep, 0, sizeof other.keep);
    CHECK_OK(step(&other));
    CHECK(same(P, now.next, other.next) && same(R, now.expect, other.expect) && same(P, now.keep, other.keep));
    was = now, other.state.lambda *= 4, was.state.lambda *= 4;
    for (i = 0; i < n; i++)
        for (j = i; j < n; j++) other.S[i * (n + 1) + j + 1] = poison();
    CHECK_OK(step(&other));
    CHECK_OK(step(&was));
    CHECK(same(P, was.next, other.next) && same(R, was.expect, other.expect) && same(P, was.keep, other.keep));
    CHECK(!same(P, now.next, other.next));
}

/* A ridge on numbers without a constraint, with some 0. */
static const roln_real *some_ridge(const problem *g)
{
    static roln_real w[MAXP];
    int b, i, at = 0;
    for (b = 0; b < g->blocks; at += roln_block_size(g->table + b), b++)
        for (i = at; i < at + roln_block_size(g->table + b); i++)
            w[i] = g->table[b].manifold == ROLN_EUCLIDEAN ? ROLN_C(0.3) * (roln_real)(i % 4) : 0;
    return w;
}

/* A step, and two more where something is remembered. */
static void test_step(const roln_block *t, int blocks, int R, uint64_t *s)
{
    static const roln_newton_opt opts[7] = {{1, 1, 0, NULL}, {8, 1, 0, NULL}, {2, ROLN_C(0.5), 2, NULL},
                                            {1, ROLN_C(0.25), 1, NULL}, {8, ROLN_C(0.5), 5, NULL},
                                            {1, 1, 0, NULL}, {8, ROLN_C(0.5), 5, NULL}}; /* these two with a ridge */
    int o, k;
    for (o = 0; o < 7; o++) {
        problem_of(t, blocks, R, &now);
        now.opt = opts[o], now.state.lambda = o % 2 ? ROLN_C(0.01) : 1;
        if (o >= 5) now.opt.ridge = some_ridge(&now);
        now.state.error = 2, now.state.taken = 3, now.state.refused = 5;
        memset(&slow.A, 0, sizeof slow.A);
        random_point(&now, s, now.x);
        random_carried(&now, s);
        for (k = 0; k < (now.opt.memory > 1 ? 3 : 1); k++) {
            random_rows(&now, s);
            check_rows();
            check_sums(k == 0);
            check_step();
            check_again();
            end_step(&now, 1);
        }
    }
}

static void test_steps(void)
{
    static const int counts[] = {1, 7, 8, 30, 61, 62, 129, 300}, wides[] = {5, 23, 24, 129, 300};
    uint64_t s = 1;
    int i;
    for (i = 0; i < 8; i++) test_step(TABLE(table), counts[i], &s);
    for (i = 0; i < 5; i++) test_step(TABLE(wide), wides[i], &s);
    for (i = 0; i < 8; i++) test_step(TABLE(flat), counts[i], &s);
}

/* ---- problems with a known end ---------------------------------------------------------------- */

/* Residuals of `now` at x, and their rows in J unless it is NULL. */
typedef void (*measure)(const problem *g, const roln_real *x, roln_real *r, roln_real *J);

/* One step of the problem, as its user takes it: with the same sums and more damping, till one is taken. How many were refused; 20:
   all, and nothing has changed. lambda < 0 is chosen by roln_newton_accept. */
static int advance(problem *g, measure f, roln_real lambda)
{
    roln_real there[MAXR];
    int refused, taken = 0;
    f(g, g->x, g->r, g->J);
    if (lambda >= 0) g->state.lambda = lambda;
    CHECK_OK(rows(g));
    sums(g);
    for (refused = 0; refused < 20 && !taken; refused += !taken) {
        CHECK_OK(step(g));
        f(g, g->next, there, NULL);
        taken = roln_newton_accept(g->R, g->r, g->weight, g->expect, there, &g->state);
        end_step(g, taken);
    }
    return refused;
}

/* b - A x, rows `at` and on of what there are. */
enum { LINE = 40, PIECE = 5, PIECES = 12 };
static roln_real linear_A[MAXR * LINE], linear_b[MAXR];
static int linear_at;
static void linear(const problem *g, const roln_real *x, roln_real *r, roln_real *J)
{
    const roln_real *A = linear_A + linear_at * g->P;
    int k;
    for (k = 0; k < g->R; k++) r[k] = linear_b[linear_at + k] - roln_dot(g->P, A + k * g->P, x);
    if (J) memcpy(J, A, (size_t)(g->R * g->P) * sizeof *J);
}

/* y = x + d, d = argmin sum_k w_k (b - A (x + d))_k^2 + lambda tr / P |d|^2 over R rows; with none of it and fewer rows than
   numbers the shortest such d. Returns the condition, about. */
static ld t_linear(int R, int P, const ld *w, ld lambda, const ld *x, ld *y)
{
    static ld B[MAXR * LINE], K[LINE * LINE], C[LINE * LINE], inverse[LINE * LINE];
    ld left[MAXR], top = 0, bottom = 0;
    const int dual = R < P && !(lambda > 0), side = dual ? R : P;
    int i, j, k;
    for (k = 0; k < R; k++) {
        for (i = 0; i < P; i++) B[k * P + i] = sqrtl(w[k]) * (ld)linear_A[k * P + i];
        left[k] = sqrtl(w[k]) * (ld)linear_b[k] - dot(P, B + k * P, x);
    }
    mul(dual ? R : P, dual ? P : R, side, !dual, B, dual, B, K);
    for (i = 0; i < side; i++) top += K[i * (side + 1)];
    for (i = 0; i < side; i++) K[i * (side + 1)] += lambda * top / P;
    for (i = 0; i < side * side; i++) C[i] = K[i], inverse[i] = i % (side + 1) == 0;
    t_solve(side, side, C, inverse);
    for (i = 0; i < side; i++) bottom += inverse[i * (side + 1)];
    if (dual) t_solve(side, 1, K, left);
    for (i = 0; i < P; i++)
        for (y[i] = 0, k = 0; k < R; k++) y[i] += B[k * P + i] * left[k];
    if (!dual) t_solve(side, 1, K, y);
    for (j = 0; j < P; j++) y[j] += x[j];
    return top * bottom;
}

/* A linear problem of full rank: the solution in one step, in more rows than parameters, as many, far fewer. */
static void test_linear(void)
{
    static const struct {
        const roln_block *table;
        int blocks, R;
    } cases[8] = {
        {TABLE(flat), .R = 1},  {TABLE(line), .R = 3},  {TABLE(line), .R = 4},   {TABLE(flat), .R = 12},
        {TABLE(flat), .R = 13}, {TABLE(flat), .R = 40}, {TABLE(flat), .R = 300}, {TABLE(line), .R = 200},
    };
    ld x[LINE], y[LINE], w[MAXR], e, size;
    uint64_t s = 2;
    int c, i, rep;
    for (i = 0; i < MAXR; i++) w[i] = 1;
    for (c = 0; c < 8; c++)
        for (rep = 0; rep < 5; rep++) {
            const int R = cases[c].R;
            int P;
            problem_of(cases[c].table, cases[c].blocks, R, &now);
            P = now.P, linear_at = 0;
            fill(R * P, 1, &s, linear_A), fill(R, 1, &s, linear_b), fill(P, 1, &s, now.x);
            widen(P, now.x, x);
            e = t_linear(R, P, w, 0, x, y) * EPS, size = 1 + sqrtl(dot(P, y, y));
            CHECK(advance(&now, linear, 0) == 0);
            BOUND("linear problem, eps of its condition", dist(P, now.x, y) / (size * e), 1);
            BOUND("error of a linear problem", (ld)now.state.error / e, 5);
            CHECK(now.state.lambda == 0 && now.state.taken == 1 && now.state.refused == 0);
            linear(&now, now.x, now.r, now.J); /* again, from there: nowhere else */
            CHECK_OK(rows(&now));
            sums(&now);
            CHECK_OK(step(&now));
            for (i = 0; i < P; i++) BOUND("second step", fabsl((ld)now.next[i] - (ld)now.x[i]) / (size * e), 1);
        }
}

/* What recursion means: linear rows come in pieces of fewer than there are numbers, and each step is that on all rows so far, each
   weighted by beta^age, of which it goes the part `rate`. Without damping the first piece has rank. */
static void check_pieces(const roln_newton_opt *opt, roln_real lambda, uint64_t *s)
{
    ld x[LINE], y[LINE], w[MAXR], e = 0;
    int k, i, P;
    problem_of(TABLE(flat), PIECE, &now);
    P = now.P, now.opt = *opt, linear_at = 0;
    fill(MAXR * P, 1, s, linear_A), fill(MAXR, 1, s, linear_b), fill(P, 1, s, now.x);
    widen(P, now.x, x);
    if (!(lambda > 0)) now.R = P + 1;
    for (k = 0; k < PIECES; k++) {
        ld c;
        CHECK(advance(&now, linear, lambda) == 0);
        memmove(now.J + PIECE * P, now.J + now.R * P, (size_t)P * sizeof *now.J);
        for (i = 0; i < linear_at; i++) w[i] *= 1 - 1 / (ld)opt->memory;
        for (; i < linear_at + now.R; i++) w[i] = 1;
        linear_at += now.R, now.R = PIECE;
        c = t_linear(linear_at, P, w, (ld)lambda, x, y);
        for (i = 0; i < P; i++) x[i] += (ld)opt->rate * (y[i] - x[i]);
        e = e * (1 - (ld)opt->rate * (lambda > 0 ? 0 : 1)) + c * (1 + sqrtl(dot(P, y, y))) * EPS;
        BOUND("linear problem in pieces, eps of its condition", dist(P, now.x, x) / e, 1);
    }
}

static void test_pieces(void)
{
    static const roln_newton_opt opts[4] = {{.memory = 8, .rate = 1},
                                            {.memory = 2, .rate = 1},
                                            {.memory = 8, .rate = ROLN_C(0.5)},
                                            {.memory = 50, .rate = 1}};
    static const roln_real damping[] = {0, ROLN_C(0.01), 1};
    uint64_t s = 9;
    int o, d;
    for (o = 0; o < 4; o++)
        for (d = 0; d < 3; d++) check_pieces(opts + o, damping[d], &s);
}

/* A ridge is P more rows in each step: sqrt(w_i) e_i, whose residual is -sqrt(w_i) x_i. */
static void check_ridge(roln_newton_opt opt, roln_real lambda, uint64_t *s)
{
    roln_real root[LINE], ridge[LINE];
    ld x[LINE], y[LINE], w[MAXR], e = 0;
    int k, i, P;
    problem_of(TABLE(flat), PIECE, &now);
    P = now.P, opt.ridge = ridge, now.opt = opt, linear_at = 0;
    for (i = 0; i < P; i++) root[i] = ROLN_C(0.25) * (roln_real)(i % 5), ridge[i] = root[i] * root[i];
    fill(MAXR * P, 1, s, linear_A), fill(MAXR, 1, s, linear_b), fill(P, 1, s, now.x);
    widen(P, now.x, x);
    if (!(lambda > 0)) now.R = P + 1;
    for (k = 0; k < PIECES; k++) {
        const int from = linear_at, end = from + now.R + P;
        ld c;
        CHECK(advance(&now, linear, lambda) == 0);
        memmove(now.J + PIECE * P, now.J + now.R * P, (size_t)P * sizeof *now.J);
        for (i = from + now.R; i < end; i++) {
            fill(P, 0, s, linear_A + i * P);
            linear_A[i * P + i - from - now.R] = root[i - from - now.R], linear_b[i] = 0;
        }
        for (i = 0; i < from; i++) w[i] *= 1 - 1 / (ld)opt.memory;
        for (; i < end; i++) w[i] = 1;
        linear_at = end, now.R = PIECE;
        c = t_linear(end, P, w, (ld)lambda, x, y);
        for (i = 0; i < P; i++) x[i] += (ld)opt.rate * (y[i] - x[i]);
        e = e * (1 - (ld)opt.rate * (lambda > 0 ? 0 : 1)) + c * (1 + sqrtl(dot(P, y, y))) * EPS;
        BOUND("with a ridge, eps of its condition", dist(P, now.x, x) / e, 1);
    }
}

static void test_ridge(void)
{
    uint64_t s = 19;
    check_ridge((roln_newton_opt){8, 1, 0, NULL}, 0, &s), check_ridge((roln_newton_opt){8, 1, 0, NULL}, ROLN_C(0.01), &s);
    check_ridge((roln_newton_opt){2, 1, 0, NULL}, 1, &s), check_ridge((roln_newton_opt){50, ROLN_C(0.5), 0, NULL}, 0, &s);
    check_ridge((roln_newton_opt){1, 1, 0, NULL}, ROLN_C(0.01), &s);
}

/* 0 - (A x - (x^T A x) x), zero at eigenvectors of the symmetric A. */
enum { EIG = 6 };
static roln_real eig_A[EIG * EIG];
static void rayleigh(const problem *g, const roln_real *x, roln_real *r, roln_real *J)
{
    roln_real y[EIG], rho;
    int k, i;
    (void)g;
    roln_mm_bt(1, EIG, EIG, x, eig_A, y);
    rho = roln_dot(EIG, x, y);
    for (k = 0; k < EIG; k++) {
        r[k] = rho * x[k] - y[k];
        for (i = 0; i < EIG && J; i++) J[k * EIG + i] = eig_A[k * EIG + i] - (k == i ? rho : 0) - 2 * x[k] * y[i];
    }
}

/* Quadratic forms of all numbers, that are known at some point of the manifold. */
enum { FORMS = 40 };
static roln_real form_a[FORMS * FEW_SIZE], form_B[FORMS * FEW_SIZE * FEW_SIZE], form_is[FORMS];
static void random_forms(uint64_t *s)
{
    int k, i;
    fill(FORMS * FEW_SIZE, 1, s, form_a), fill(FORMS * FEW_SIZE * FEW_SIZE, 0.2L, s, form_B);
    for (k = 0; k < FORMS; k++)
        for (i = 0; i < FEW_SIZE * FEW_SIZE; i++)
            form_B[(k * FEW_SIZE + i % FEW_SIZE) * FEW_SIZE + i / FEW_SIZE] = form_B[k * FEW_SIZE * FEW_SIZE + i];
}

static void forms(const problem *g, const roln_real *x, roln_real *r, roln_real *J)
{
    const int P = FEW_SIZE;
    roln_real y[FEW_SIZE];
    int k, i;
    for (k = 0; k < g->R; k++) { /* a x + x^T B x / 2 */
        roln_mm_bt(1, P, P, x, form_B + k * P * P, y);
        r[k] = form_is[k] - (roln_dot(P, form_a + k * P, x) + roln_dot(P, y, x) / 2);
        for (i = 0; i < P && J; i++) J[k * P + i] = form_a[k * P + i] + y[i];
    }
}

/* The projector Phi Psi^T, that is known; what it says of Phi and Psi leaves a change of basis free. */
static roln_real projector_is[16];
static void projector(const problem *g, const roln_real *x, roln_real *r, roln_real *J)
{
    int k, i, c;
    (void)g;
    for (k = 0; k < 16; k++) {
        roln_real sum = 0;
        for (i = 0; i < 16 && J; i++) J[k * 16 + i] = 0;
        for (c = 0; c < 2; c++) {
            const int left = c * 4 + k / 4, right = 8 + c * 4 + k % 4;
            sum += x[left] * x[right];
            if (J) J[k * 16 + left] = x[right], J[k * 16 + right] = x[left];
        }
        r[k] = projector_is[k] - sum;
    }
}

/* x, some way along a random tangent. */
static void nearby(const problem *g, ld way, uint64_t *s, roln_real *x)
{
    roln_real u[MAXP], work[400];
    int b, i;
    fill(g->P, way, s, u);
    for (b = i = 0; b < g->blocks; i += roln_block_size(g->table + b), b++) {
        const roln_block *t = g->table + b;
        int k;
        for (k = i; k < i + roln_block_size(t) && t->manifold == ROLN_EUCLIDEAN; k++) x[k] += u[k];
        if (t->manifold == ROLN_EUCLIDEAN) continue;
        CHECK_OK(t->manifold->tangent(t->rows, t->cols, x + i, 0, g->P, u + i, work));
        CHECK_OK(t->manifold->retract(t->rows, t->cols, x + i, u + i, x + i, work));
    }
}

/* Steps with next to no damping and no memory: the length of the residuals is about squared every time, till rounding ends it. */
static void check_quadratic(const char *what, measure f, ld factor, ld rounding)
{
    const ld lambda = sqrtl(EPS) / 64; /* which is next to none */
    ld e[12];
    int k, fast = 0;
    for (k = 0; k < 12; k++) {
        f(&now, now.x, now.r, now.J);
        e[k] = sqrtl((ld)roln_dot(now.R, now.r, now.r));
        if (k > 0) {
            BOUND(what, e[k] / (factor * e[k - 1] * e[k - 1] + 8 * sqrtl(EPS) * e[k - 1] + rounding * EPS), 1);
            fast += e[k] < 0.1L * e[k - 1];
        }
        now.state.lambda = (roln_real)lambda;
        CHECK_OK(rows(&now));
        sums(&now);
        CHECK_OK(step(&now));
        memcpy(now.x, now.next, sizeof now.x);
    }
    CHECK(fast >= PICK(2, 3));
    BOUND("residuals in the end, of their rounding", e[11] / (rounding * EPS), 1);
}

/* From further away, with damping as it comes, until rounding refuses all: taken and refused steps. */
static void check_default(const char *what, measure f, roln_real memory, int most, ld rounding)
{
    const roln_newton start = ROLN_NEWTON_START;
    int k, tries = 0, refused = 0;
    now.state = start, now.opt.memory = memory;
    memset(now.S, 0, sizeof now.S), memset(now.J, 0, sizeof now.J);
    for (k = 0; k < most && refused < 20; k++) {
        refused = advance(&now, f, -1);
        tries += refused + (refused < 20);
    }
    CHECK((int)(now.state.taken + now.state.refused) == tries && (int)now.state.taken >= k - 1);
    f(&now, now.x, now.r, NULL);
    BOUND(what, sqrtl((ld)roln_dot(now.R, now.r, now.r)) / (rounding * EPS), 1);
}

static void test_rayleigh(void)
{
    static const roln_block ball[] = {{&sphere, 1, EIG, 0}};
    ld A[EIG * EIG], V[EIG * EIG];
    uint64_t s = 3;
    int rep, i, j, v;
    for (rep = 0; rep < 20; rep++) {
        for (i = 0; i < EIG; i++)
            for (j = 0; j <= i; j++) eig_A[i * EIG + j] = eig_A[j * EIG + i] = roln_normal(&s) / 4 + (i == j ? (roln_real)i : 0);
        widen(EIG * EIG, eig_A, A);
        t_jacobi(EIG, A, V);
        v = rep % EIG;
        problem_of(TABLE(ball), EIG, &now);
        for (i = 0; i < EIG; i++) now.x[i] = (roln_real)V[i * EIG + v];
        nearby(&now, 0.15L, &s, now.x);
        check_quadratic("Rayleigh quotient", rayleigh, 8, 40);
        for (i = 0, A[0] = 0; i < EIG; i++) A[0] += (ld)now.x[i] * V[i * EIG + v];
        CHECK_NEAR(fabsl(A[0]), 1, 20 * EPS); /* the eigenvector that was near */
        random_point(&now, &s, now.x);
        check_default("Rayleigh quotient from afar", rayleigh, rep % 2 ? 1 : 2, 60, 40);
    }
}

static void test_toys(void)
{
    static const roln_block pair[] = {{&roln_biorthogonal, 2, 4, 0}};
    static const int counts[] = {FORMS, 23, 3}; /* more equations than unknowns; more than dimensions; far fewer */
    uint64_t s = 4;
    int rep, c;
    for (rep = 0; rep < 10; rep++) {
        for (c = 0; c < 3; c++) {
            problem_of(TABLE(few), FORMS, &now);
            random_forms(&s);
            random_point(&now, &s, now.x);
            memset(form_is, 0, sizeof form_is);
            forms(&now, now.x, form_is, NULL);
            for (int k = 0; k < FORMS; k++) form_is[k] = -form_is[k];
            now.R = counts[c], now.side = ROLN_NEWTON_SIDE(now.R, now.P);
            nearby(&now, 0.02L, &s, now.x);
            was = now;
            check_quadratic("forms", forms, 60, 400);
            now = was;
            check_default("forms as it comes", forms, rep % 2 ? 1 : 2, 60, 600);
        }
        problem_of(TABLE(pair), 16, &now);
        random_point(&now, &s, now.x);
        memset(projector_is, 0, sizeof projector_is);
        projector(&now, now.x, projector_is, NULL);
        for (c = 0; c < 16; c++) projector_is[c] = -projector_is[c];
        nearby(&now, 0.05L, &s, now.x);
        was = now;
        check_quadratic("projector", projector, 8, 10);
        now = was;
        check_default("projector as it comes", projector, rep % 2 ? 1 : 2, 60, 10);
        CHECK_BELOW(defect(2, 4, now.x) / EPS, 4);
    }
}

/* ---- what must fail, and what must be refused -------------------------------------------------- */

/* A manifold without constraints and without long steps; its limit is in its point. */
static roln_status wall_tangent(int n, int cols, const roln_real *x, int count, int stride, roln_real *gm, roln_real *work)
{
    (void)n, (void)cols, (void)x, (void)count, (void)stride, (void)gm, (void)work;
    return ROLN_OK;
}

static roln_status wall_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    const int n = rows * cols;
    int i, ok = 1;
    (void)work;
    for (i = 0; i < n; i++) ok &= ROLN_ABS(u[i]) <= x[n - 1], xn[i] = i < n - 1 ? x[i] + u[i] : x[i];
    return ok ? ROLN_OK : ROLN_E_ILL_CONDITIONED;
}

static const roln_manifold wall = {free_size, no_work, wall_tangent, NULL, wall_retract};
static const roln_block walled[] = {{ROLN_EUCLIDEAN, 1, 1, 0}, {&wall, 1, 63, 0}};

/* `now` is `was` but for what a step writes, and J, of which nothing is promised where a manifold refuses it. */
static int kept(void)
{
    return same(MAXP, now.x, was.x) && same(MAXR, now.r, was.r) && same(MAXR, now.weight, was.weight) && same_sums(&now, was.S) &&
           memcmp(&now.state, &was.state, sizeof now.state) == 0;
}

static int unchanged(void)
{
    return kept() && same((MAXR + 1) * MAXP, now.J, was.J);
}

/* Every number of the rows and of what is carried, every residual, the settings; what a manifold says; a metric of its own. */
static void test_rows_status(void)
{
    static const roln_block modal[] = {{ROLN_EUCLIDEAN, 1, 2, 0}, {&mode, 1, MASSES, 0}};
    static const roln_real bad[] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY}, small[] = {ROLN_C(0.5), 0, -1};
    uint64_t s = 5;
    int i, b;
    problem_of(TABLE(table), 7, &now);
    point_of_table(&s, now.x);
    random_rows(&now, &s), random_carried(&now, &s);
    now.opt.cap = 2, now.state.loss = 3, now.state.error = 4;
    was = now;
    for (i = 0; i < 8 * SIZE + 7 + 4; i++)
        for (b = 0; b < 3; b++) {
            now = was;
            if (i < 8 * SIZE) now.J[i] = bad[b];
            else if (i < 8 * SIZE + 7) now.r[i - 8 * SIZE] = bad[b];
            else if (i == 8 * SIZE + 7) now.opt.cap = bad[b];
            else if (i == 8 * SIZE + 8) now.opt.memory = bad[b];
            else if (i == 8 * SIZE + 9) now.opt.memory = small[b];
            else now.r[b] = PICK(1e30f, 1e300); /* its square is not finite */
            other = now;
            CHECK(rows(&now) == (i == 8 * SIZE + 9 ? ROLN_E_RANGE : ROLN_E_NOT_FINITE));
            CHECK(memcmp(&now, &other, sizeof now) == 0);
        }
    other = was, was.x[AT_S] = -1, now = was;
    CHECK(rows(&now) == ROLN_E_NOT_SPD && kept());
    was = other, memset(was.x + AT_B2, 0, 12 * sizeof *was.x), now = was;
    CHECK(rows(&now) == ROLN_E_ILL_CONDITIONED && kept());
    problem_of(TABLE(modal), 7, &now);
    random_point(&now, &s, now.x), random_rows(&now, &s);
    was = now;
    CHECK(rows(&now) == ROLN_E_SHAPE && kept());
}

/* Settings that are none, too little damping, retractions that fail: nothing has changed. */
static void test_step_status(void)
{
    static const roln_real bad[] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, -1, ROLN_C(0.5), 0};
    static const int counts[] = {40, 3}; /* all rows; the system of the rows */
    uint64_t s = 6;
    int c, i, b;
    for (c = 0; c < 2; c++) {
        problem_of(TABLE(few), counts[c], &now);
        random_point(&now, &s, now.x), random_rows(&now, &s), random_carried(&now, &s);
        now.opt.memory = 3, now.state.taken = 1, now.state.error = 3;
        CHECK_OK(rows(&now));
        sums(&now);
        was = now;
        for (i = 0; i < 3; i++)
            for (b = 0; b < (i == 0 ? 4 : i == 1 ? 3 : 6); b++) {
                now = was;
                *(i == 0 ? &now.state.lambda : i == 1 ? &now.opt.rate : &now.opt.memory) = bad[b];
                other = now;
                CHECK(step(&now) == (i == 2 && b > 2 ? ROLN_E_RANGE : ROLN_E_NOT_FINITE));
                CHECK(memcmp(&now.state, &other.state, sizeof now.state) == 0);
                now.state = was.state;
                CHECK(unchanged());
            }
        now = was;
        memset(now.J, 0, sizeof now.J), memset(now.S, 0, sizeof now.S); /* no rows at all: no damping is enough */
        sums(&now);
        was = now;
        CHECK(step(&now) == ROLN_E_NOT_SPD && unchanged());
    }
}

/* Steps that end beyond all numbers, and ones that foretell what is there. */
static void check_beyond(int R)
{
    uint64_t s = 10;
    int i, k;
    for (i = 0; i < 2; i++) {
        problem_of(TABLE(line), R, &now);
        random_rows(&now, &s);
        for (k = 0; k < R * now.P && i; k++) now.J[k] *= PICK(1e10f, 1e80); /* d is as much shorter */
        now.state.lambda = 0, now.opt.rate = i ? PICK(1e36f, 1e250) : PICK(3e38f, 1e308);
        for (k = 0; k < R; k++) now.r[k] *= PICK(1e4f, 1e60);
        CHECK_OK(rows(&now));
        sums(&now);
        was = now;
        CHECK(step(&now) == ROLN_E_NOT_FINITE && unchanged());
        CHECK(roln_all_finite(now.P, now.next) == i && roln_all_finite(R, now.expect) == !i);
    }
}

/* J has lost rank, exactly: without damping a status, with little as much as it takes. */
static void check_rank(int R)
{
    const int P = 64;
    roln_real lambda;
    int i, k;
    problem_of(TABLE(walled), R, &now);
    for (k = 0; k < R; k++) /* sums of 64 ones, whose roots are exact */
        for (i = 0; i < P; i++) now.J[k * P + i] = R < 9 || i < 2 || i == k;
    for (i = 0; i < R; i++) now.r[i] = (roln_real)i + 1;
    now.x[63] = 1000; /* far */
    CHECK_OK(rows(&now));
    sums(&now);
    now.state.lambda = 0, was = now;
    CHECK(step(&now) == ROLN_E_NOT_SPD && unchanged());
    now.state.lambda = lambda = PICK(1e-20f, 1e-30);
    CHECK_OK(step(&now));
    CHECK(now.state.lambda > lambda && now.state.lambda < 256 * ROLN_EPS);
    for (; lambda < now.state.lambda; lambda *= 8) {}
    CHECK(lambda == now.state.lambda);
    now.state = was.state;
    CHECK(unchanged());
}

/* Steps that are too long for a manifold are damped till they are not; lambda keeps what it took. */
static void check_long(int R)
{
    const int P = 64, in_rows = R < 9;
    const double carried = 7 * 0.9 / R;
    int i;
    problem_of(TABLE(walled), R, &now);
    for (i = 0; i < R; i++) now.J[P * i + 1] = 1, now.r[i] = 8; /* d = 8 R / (R + lambda R / 64) */
    now.x[63] = ROLN_C(0.25);
    CHECK_OK(rows(&now));
    sums(&now);
    now.state.lambda = ROLN_C(0.125), was = now;
    CHECK_OK(step(&now));
    CHECK(now.state.lambda == 4096); /* 512: 8 / 9 */
    CHECK_NEAR(now.next[1], 8.0 / 65, 8 * EPS);
    CHECK_NEAR(now.expect[R - 1], 8 - 8.0 / 65, 16 * EPS);
    CHECK_NEAR(now.keep[1], in_rows ? 8.0 / 65 : 8 * R * 64 / 65.0, 8 * EPS * R);
    other = now, now = was; /* something is carried: rest asks for more, a last step that is too long by itself is dropped */
    now.opt.memory = 10, now.J[P * R + 1] = 7;
    CHECK_OK(step(&now));
    CHECK(now.state.lambda == 4096);
    CHECK_NEAR(now.next[1], in_rows ? 8.0 / 65 : (8 + carried) / 65, 8 * EPS);
    CHECK(!in_rows || (same(P, now.next, other.next) && same(P, now.keep, other.keep)));
    now.opt.memory = ROLN_C(1.0078125); /* and one that is not stays */
    CHECK_OK(step(&now));
    CHECK(now.state.lambda == 4096 && !same(P, now.next, other.next));
    now = was, now.state.lambda = 0, now.J[0] = 1;
    for (i = 0; i < R; i++) now.J[P * i + i] += 1; /* of full rank */
    if (!in_rows) return;
    sums(&now);
    was = now;
    CHECK(step(&now) == ROLN_E_ILL_CONDITIONED && unchanged()); /* no damping is ever added */
    now.state.lambda = was.state.lambda = 1, now.x[63] = was.x[63] = -1;
    CHECK(step(&now) == ROLN_E_ILL_CONDITIONED && unchanged()); /* none helps */
}

static void test_damping(void)
{
    check_beyond(200), check_beyond(4);
    check_rank(64), check_rank(3);
    check_long(16), check_long(3);
}

/* What the residuals say of a step that was to change them by 2, of a scaled row and another. Long: the cases follow from each
   other. */
static void test_judge(void)
{
    static const struct {
        double error;
        int take;
        double factor;
    } cases[13] = {
        {.error = 0, .take = 1, .factor = 1 / 3.0},
        {.error = 0.05, .take = 1, .factor = 1 / 3.0},
        {.error = 0.0566, .take = 1, .factor = 1 / 3.0},
        {.error = 0.1, .take = 1, .factor = 0.1 / 0.17},
        {.error = 0.17, .take = 1, .factor = 1},
        {.error = 0.25, .take = 1, .factor = 0.25 / 0.17},
        {.error = 0.339, .take = 1, .factor = 0.339 / 0.17},
        {.error = 0.5, .take = 1, .factor = 2},
        {.error = 0.99, .take = 1, .factor = 2},
        {.error = 1.01, .take = 0, .factor = 4},
        {.error = 50, .take = 0, .factor = 4},
        {.error = NAN, .take = 0, .factor = 4},
        {.error = INFINITY, .take = 0, .factor = 4},
    };
    static const roln_real r[3] = {2, 1, 5}, weight[3] = {ROLN_C(0.5), 1, 1}, expect[3] = {0, 1, 5};
    const roln_newton start = {ROLN_C(0.5), 4, 9, 10, 20};
    roln_newton g;
    roln_real there[3], far[3] = {0, 1, 5};
    int i, row;
    for (i = 0; i < 13; i++)
        for (row = 0; row < 2; row++) {
            const int take = cases[i].take;
            there[0] = 0, there[1] = 1, there[2] = 5;
            there[row] += (roln_real)((row ? 2 : 4) * cases[i].error);
            g = start;
            CHECK(roln_newton_accept(3, r, weight, expect, there, &g) == take);
            CHECK_NEAR(g.error, take ? cases[i].error : 9, 20 * EPS);
            CHECK_NEAR(g.lambda, 0.5 * cases[i].factor, 8 * EPS);
            CHECK(g.taken == 10 + (uint32_t)take && g.refused == 20 + (uint32_t)!take && g.loss == 4);
        }
    /* rows behind those that judge are not looked at */
    there[0] = there[1] = 1, there[2] = (roln_real)NAN;
    g = start;
    CHECK(roln_newton_accept(3, r, weight, expect, there, &g) == 0);
    CHECK(roln_newton_accept(2, r, weight, expect, there, &g) == 1), CHECK_NEAR(g.error, 0.25, EPS);
    /* no change is foretold: none is right, any other wrong; one that is beyond all numbers foretells nothing */
    g = start, there[2] = 5;
    CHECK(roln_newton_accept(2, r + 1, weight + 1, expect + 1, there + 1, &g) == 1 && g.error <= 0);
    CHECK_NEAR(g.lambda, 0.5 / 3, EPS);
    there[2] = 5 + 8 * ROLN_EPS;
    CHECK(roln_newton_accept(2, r + 1, weight + 1, expect + 1, there + 1, &g) == 0);
    /* a change below a thousandth of the rows is rounding, whether it is taken or not: less damping */
    for (i = 0; i < 4; i++) {
        const roln_real large[2] = {1000, 0}, from[2] = {i % 2 ? ROLN_C(999.0625) : ROLN_C(998.9375), 0};
        there[0] = from[0] + (i < 2 ? ROLN_C(0.9) : 2), there[1] = 0, g = start;
        CHECK(roln_newton_accept(2, large, weight + 1, from, there, &g) == (i < 2));
        CHECK_NEAR(g.lambda, 0.5 * (i % 2 ? 1 / 3.0 : i < 2 ? 2 : 4), EPS);
    }
    there[0] = 0, there[1] = 1, there[2] = 5, g = start;
    far[0] = PICK(1e30f, 1e300), CHECK(roln_newton_accept(2, far, weight, expect, there, &g) == 0);
    /* no damping stays none; damping has an end on both sides */
    g = start, g.lambda = 0, there[0] = there[1] = 1;
    CHECK(roln_newton_accept(2, r, weight, expect, there, &g) == 1 && g.lambda == 0);
    there[0] = 5;
    CHECK(roln_newton_accept(2, r, weight, expect, there, &g) == 0 && g.lambda == 0);
    for (g.lambda = 1, there[0] = 0, i = 0; i < 200; i++) roln_newton_accept(2, r, weight, expect, there, &g);
    CHECK(g.lambda == ROLN_EPS);
    for (there[0] = 5, i = 0; i < 2000; i++) roln_newton_accept(2, r, weight, expect, there, &g);
    CHECK(g.lambda == 1 / ROLN_EPS);
}

static void test_over(void)
{
    static const double before[5] = {0.125, 0.5, 3, 0, 0.5}, lambda[5] = {512, 2048, 12288, 0, 0.125};
    static const double after[5] = {0.5, 1, 3, 0, 0.125};
    roln_newton g = {1, 4, 9, 10, 20};
    int i;
    /* when it is over 4 times stay, up to 1; damping beyond that stays what it was, none stays none, less is less */
    for (i = 0; i < 5; i++)
        g.lambda = (roln_real)lambda[i], roln_newton_give_up((roln_real)before[i], &g), CHECK(g.lambda == (roln_real)after[i]);
    CHECK(g.loss == 4 && g.error == 9 && g.taken == 10 && g.refused == 20);
}

/* ---- many steps ------------------------------------------------------------------------------- */

/* A pair after 100,000 steps of a few random rows that are remembered; the encoder undoes the decoder still. */
static void test_pair(int R, roln_real memory, uint64_t s)
{
    static const roln_block pair[] = {{&roln_biorthogonal, 2, 4, 0}};
    const roln_newton_system system = {R, 16, now.J, now.r, now.S};
    ld top = 0, moved = 0;
    int k, i, ok = 1;
    problem_of(TABLE(pair), R, &now);
    now.opt.memory = memory, now.opt.cap = 3, now.state.lambda = ROLN_C(0.1);
    random_point(&now, &s, now.x);
    for (k = 0; k < 100000; k++) {
        for (i = 0; i < R * 16; i++) now.J[i] = roln_uniform(&s) - ROLN_C(0.5);
        for (i = 0; i < R; i++) now.r[i] = ROLN_C(0.05) * (roln_uniform(&s) - ROLN_C(0.5));
        ok &= roln_newton_rows(now.blocks, now.table, &now.opt, R, now.x, now.J, now.r, now.weight, &now.state, room) == ROLN_OK;
        roln_newton_normal_equations(&now.opt, R, 16, 0, now.side, now.J, now.S, room);
        ok &= roln_newton_step(now.blocks, now.table, &now.opt, &system, now.x, &now.state, now.next, now.expect, now.keep, room) ==
              ROLN_OK;
        for (i = 0; i < 16; i++) moved += fabsl((ld)now.next[i] - (ld)now.x[i]) / 100;
        end_step(&now, 1);
        if (k % 100 == 99) {
            const ld d = defect(2, 4, now.x) / EPS;
            if (!(d <= top)) top = d;
        }
    }
    CHECK(ok && moved > 10);
    BOUND("Psi^T Phi - I after 100,000 steps, eps", top, 2);
}

/* The table, 3,000 steps: on every manifold still. */
static void test_table(int R, roln_real memory, ld size, uint64_t s)
{
    ld start[SIZE], moved = 0;
    int k, i, b;
    problem_of(TABLE(table), R, &now);
    now.opt.memory = memory, now.state.lambda = ROLN_C(0.1);
    point_of_table(&s, now.x);
    widen(SIZE, now.x, start);
    for (k = 0; k < 3000; k++) {
        fill(R * SIZE, 1, &s, now.J), fill(R, size, &s, now.r);
        CHECK_OK(rows(&now));
        sums(&now);
        CHECK_OK(step(&now));
        end_step(&now, 1);
        BOUND("pair, eps", defect(2, 5, now.x + AT_B) / EPS, 4);
        BOUND("rows of a Stiefel matrix, eps", skewness(2, 4, now.x + AT_T) / EPS, 6);
        BOUND("length on the sphere, eps", skewness(1, 3, now.x + AT_U) / EPS, 6);
        for (b = 0; b < 9; b++) CHECK(now.x[AT_S + b] == now.x[AT_S + b % 3 * 3 + b / 3]);
    }
    for (i = 0; i < SIZE; i++) moved += fabsl((ld)now.x[i] - start[i]) > 0.1L;
    CHECK(moved > SIZE / 2);
}

/* Rows and residuals that never change lead a block as far as it goes, and every step is made; with opposite residuals the point
   leaves the place where it turns. */
static void check_back(const roln_block *b, int R, roln_real memory, ld size, int steps, uint64_t s)
{
    static roln_real J[MAXR * MAXP], r[MAXR], turn[MAXP];
    int k, i, ok = 1, back = 0;
    problem_of(b, 1, R, &now);
    now.opt.memory = memory, now.opt.cap = 0, now.state.lambda = ROLN_C(0.1);
    random_point(&now, &s, now.x);
    if (b->manifold == &roln_biorthogonal) point(b->rows, b->cols, 1, &s, now.x);
    fill(R * now.P, 1, &s, J), fill(R, size, &s, r);
    for (k = 0; k < steps + steps / 10; k++) {
        if (k == steps) memcpy(turn, now.x, sizeof turn);
        memcpy(now.J, J, (size_t)(R * now.P) * sizeof *J);
        for (i = 0; i < R; i++) /* opposite but for a tenth: where J^T r is 0, J^T (-r) is 0, too */
            now.r[i] = k < steps ? r[i] : -r[i] * (1 + ROLN_C(0.1) * (roln_real)(i % 3));
        ok &= rows(&now) == ROLN_OK;
        sums(&now);
        ok &= step(&now) == ROLN_OK;
        end_step(&now, 1);
        if (b->manifold == &roln_biorthogonal) ok &= apart(b->rows, b->cols, now.x) <= 84 * EPS;
    }
    for (i = 0; i < now.P; i++) back |= ROLN_ABS(now.x[i] - turn[i]) > 0;
    CHECK(ok && (back || (b->manifold == &roln_spd && b->rows == 1))); /* d = r / J X is 0 to rounding where X is large */
}

static void test_back(void)
{
    static const roln_block road[] = {{ROLN_EUCLIDEAN, 1, 8, 0}, {&roln_spd, 1, 1, 0}, {&roln_spd, 4, 4, 0},
                                      {&roln_biorthogonal, 1, 1, 0}, {&roln_biorthogonal, 2, 8, 0},
                                      {&roln_biorthogonal, 4, 4, 0}, {&roln_stiefel, 2, 8, 0}, {&sphere, 1, 8, 0}};
    const int steps = check_sample ? 1000 : 20000;
    int k, q;
    for (k = 0; k < (int)(sizeof road / sizeof *road); k++)
        for (q = 0; q < 3; q++) {
            check_back(road + k, 3, 8, q == 0 ? 0.01L : q == 1 ? 1 : 100, steps, 31);
            check_back(road + k, 1, 1, q == 0 ? 0.01L : q == 1 ? 1 : 100, steps, 32);
        }
}

/* What no row asks for fades to nothing, not to numbers that some processors hold for nothing and others count slowly. */
static void test_fading(void)
{
    uint64_t s = 12;
    int i, k;
    problem_of(TABLE(flat), 5, &now);
    now.opt.memory = 8;
    fill(5 * 12, 1, &s, now.J);
    sums(&now);
    memset(now.J, 0, sizeof now.J);
    for (k = 0; k < PICK(700, 6000); k++) {
        sums(&now);
        for (i = 0; i < 12; i++) CHECK(now.S[i * 14] <= 0 || now.S[i * 14] > ROLN_C(1e-31));
    }
    CHECK(now.S[0] <= 0);
}

static void test_walks(void)
{
    test_fading();
    test_pair(3, 8, 7), test_pair(1, 10, 7);
    test_table(8, 8, 0.2L, 8), test_table(5, 10, 0.05L, 8);
}

void TEST_NAME(newton)(void)
{
    test_steps();
    test_linear();
    test_pieces();
    test_ridge();
    test_rayleigh();
    test_toys();
    test_rows_status();
    test_step_status();
    test_damping();
    test_judge();
    test_over();
    test_walks();
    test_back();
    print_bounds();
}
