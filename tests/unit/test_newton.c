/* Riemannian Gauss-Newton: the step (roln_riem.h, section 6) against a dense solution of its definition in long double, on tables
   of every manifold; problems with a known end; what must fail or be refused, and leave everything as it was; its shell (roln.h)
   at work on small models. Rows of residuals: test_roln.c. */
#define ROLN_NAME arm /* two links, no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 10, 10
#define ROLN_ROWS 360
#include "roln.h"

#define ROLN_NAME hand /* every manifold, all of it learned; fewer rows than parameters and more */
#define ROLN_AE 5, 4, 2
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 3
#define ROLN_WIDTH 3
#define ROLN_LAYERS gyro, bimap, reeig
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#define ROLN_BLOCK 2
#define ROLN_ROWS 230
#define ROLN_LEARN everything
#include "roln.h"

#define ROLN_NAME palm /* the same, its networks alone */
#define ROLN_AE 5, 4, 2
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 3
#define ROLN_WIDTH 3
#define ROLN_LAYERS gyro, bimap, reeig
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 3
#define ROLN_BLOCK 2
#define ROLN_ROWS 20
#define ROLN_LEARN networks
#include "roln.h"

#include "manifolds.h"
#include "room.h"

void TEST_NAME(newton)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* ---- problems --------------------------------------------------------------------------------- */

enum { MAXR = 400, MAXP = 200 };

/* A table of more parameters than a block of sums has terms, so that a system in the rows has more rows than that, too. */
enum { WIDE_SIZE = 130 + 48 + 9 + 4 };
static const roln_block wide[] = {{&roln_biorthogonal, 3, 8, 0}, {ROLN_EUCLIDEAN, 1, 130, 0}, {&mode, 0, 4, 0},
                                  {&roln_spd, 3, 3, 0},
                                  {&sphere, 1, 4, 0}};
/* Numbers without a constraint, in three blocks. */
static const roln_block flat[] = {{ROLN_EUCLIDEAN, 2, 3, 0}, {&roln_spd, 0, 0, 0}, {ROLN_EUCLIDEAN, 6, 1, 0}};
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
    roln_real x[MAXP], J[(MAXR + 1) * MAXP], r[MAXR], S[MAXP * (MAXP + 1)], d[MAXP], next[MAXP];
} problem;

static void problem_of(const roln_block *t, int blocks, int R, problem *g)
{
    const roln_newton_opt opt = {1, 0, 0};
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

/* Random rows and residuals, some of them ten times as large, and a last step, which is symmetric in the frame of a matrix. */
static void random_rows(problem *g, uint64_t *s)
{
    roln_real *old = g->J + g->R * g->P;
    int k, b, i;
    fill(g->R * g->P, 1, s, g->J);
    fill(g->P, 0.005L, s, old);
    for (b = 0; b < g->blocks; old += roln_block_size(g->table + b), b++) {
        const int n = g->table[b].rows;
        for (i = 0; i < n * n && g->table[b].manifold == &roln_spd; i++) old[i] = old[i % n * n + i / n];
    }
    for (k = 0; k < g->R; k++) fill(1, k % 7 == 3 ? 0.1L : 0.01L, s, g->r + k);
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
        roln_newton_rows(g->blocks, g->table, &g->opt, g->R, g->x, g->J, g->r, &g->state, room_of(verb_of(g)));
    CHECK_BELOW(room_used(), room_end);
    return st;
}

static void sums(problem *g)
{
    roln_newton_sums(g->R, g->P, 0, g->side, g->J, g->S, room_of(ROLN_SYM_WORK));
    CHECK_BELOW(room_used(), room_end);
}

static roln_status step(problem *g)
{
    const roln_newton_system system = {g->R, g->P, g->J, g->r, g->S};
    const roln_status st = roln_newton_step(g->blocks, g->table, &g->opt, &system, g->x, &g->state, g->d, g->next,
                                            room_of(ROLN_NEWTON_STEP_WORK(g->R, g->P, verb_of(g))));
    CHECK_BELOW(room_used(), room_end);
    return st;
}

/* ---- the twin --------------------------------------------------------------------------------- */

typedef struct {
    ld J[(MAXR + 1) * MAXP], r[MAXR], size[MAXR + 1]; /* size: of a row before it was projected */
    ld d[MAXP], next[MAXP], bound, loss, hope, trace, condition;
    int capped;
} twin;

/* The Riemannian gradient of u at x in the coordinates of the manifold; carried: u is the last step. */
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

/* Huber's loss of a residual. */
static ld t_huber(ld r, ld bound)
{
    return bound > 0 && fabsl(r) > bound ? 2 * bound * fabsl(r) - bound * bound : r * r;
}

/* Rows and residuals as roln_newton_rows makes them: w^2 r^2 has the slope of Huber's loss. */
static void t_rows(const problem *g, twin *t)
{
    const int R = g->R, P = g->P;
    ld x[MAXP], sum = 0;
    int b, k, i, at = 0;
    widen(P, g->x, x), widen((R + 1) * P, g->J, t->J), widen(R, g->r, t->r);
    for (k = 0; k <= R; k++) t->size[k] = sqrtl(dot(P, t->J + k * P, t->J + k * P));
    for (b = 0; b < g->blocks; at += roln_block_size(g->table + b), b++)
        for (k = 0; k <= R && roln_block_size(g->table + b) > 0; k++) t_tangent(g->table + b, x + at, k == R, t->J + k * P + at);
    t->bound = (ld)g->opt.cap * sqrtl(dot(R, t->r, t->r) / R), t->capped = 0;
    for (k = 0; k < R; k++) {
        const ld r = t->r[k], a = fabsl(r);
        sum += t_huber(r, t->bound);
        if (!(t->bound > 0) || a <= t->bound) continue;
        for (i = 0; i < P; i++) t->J[k * P + i] *= sqrtl(t->bound / a);
        t->r[k] *= sqrtl(t->bound / a), t->capped++;
    }
    t->loss = sum;
}

/* The minimiser of |J d - r|^2 + s |d - mu d_old|^2, where the derivative vanishes: (J^T J + s I) d = J^T r + s mu d_old. */
static void t_step(const problem *g, twin *t)
{
    static ld K[MAXP * MAXP];
    const int R = g->R, P = g->P;
    const ld *old = t->J + R * P;
    ld x[MAXP], u[MAXP], s, rate = (ld)g->opt.rate;
    int b, k, i, j, at = 0;
    for (i = 0; i < P; i++)
        for (j = 0; j < P; j++)
            for (K[i * P + j] = 0, k = 0; k < R; k++) K[i * P + j] += t->J[k * P + i] * t->J[k * P + j];
    for (t->trace = 0, i = 0; i < P; i++) t->trace += K[i * P + i];
    s = (ld)g->state.lambda * t->trace / P, t->condition = 1 + t->trace / s;
    for (i = 0; i < P; i++) {
        t->d[i] = s * (ld)g->opt.momentum * old[i];
        for (k = 0; k < R; k++) t->d[i] += t->J[k * P + i] * t->r[k];
        K[i * P + i] += s;
    }
    t_solve(P, 1, K, t->d);
    t->hope = 0;
    for (k = 0; k < R; k++) {
        const ld left = t->r[k] - rate * dot(P, t->J + k * P, t->d);
        t->hope += t->r[k] * t->r[k] - left * left;
    }
    widen(P, g->x, x);
    for (i = 0; i < P; i++) u[i] = rate * t->d[i];
    for (b = 0; b < g->blocks; at += roln_block_size(g->table + b), b++)
        if (roln_block_size(g->table + b) > 0) t_retraction(g->table + b, x + at, u + at, t->next + at);
}

/* ---- one step, in every way ------------------------------------------------------------------- */

static problem now, was, other;
static twin slow;

/* Rows of many are the bits of rows one by one, and a last step without rows is that with them. */
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
        BOUND("rows, eps of their size", dist(P, now.J + k * P, slow.J + k * P) / (slow.size[k] * EPS), 12);
    BOUND("residuals, eps", dist(R, now.r, slow.r) / (sqrtl(dot(R, slow.r, slow.r)) * EPS), 2);
    BOUND("bound of residuals, eps", fabsl((ld)now.state.bound - slow.bound) / (slow.bound * EPS + 1e-30L), 4);
    BOUND("loss, eps", fabsl((ld)now.state.loss - slow.loss) / (slow.loss * EPS), 8);
    CHECK(same(P, now.x, was.x) && now.state.lambda == was.state.lambda && now.state.hope == was.state.hope);
    CHECK(now.opt.cap > 0 ? slow.capped < R : slow.capped == 0);
    CHECK(!(now.opt.cap > 0) || slow.capped > 0 || now.opt.cap > 2 || R < 20);
    if (now.opt.cap > 0) return;
    for (b = at = 0; b < now.blocks; at += roln_block_size(now.table + b), b++) /* free numbers stay as they are */
        for (k = 0; k <= R && now.table[b].manifold == ROLN_EUCLIDEAN; k++)
            for (i = at; i < at + roln_block_size(now.table + b); i++) CHECK(now.J[k * P + i] == was.J[k * P + i]);
    CHECK(same(R, now.r, was.r));
    check_single_rows(&was, &now);
}

/* However they are divided, and not beyond the system. */
static void check_sums(void)
{
    const int size = now.side * (now.side + 1), cut = 7 * now.side / 10;
    int i;
    for (i = 0; i < MAXP * (MAXP + 1); i++) now.S[i] = other.S[i] = poison();
    sums(&now);
    roln_newton_sums(now.R, now.P, cut, now.side + 3, now.J, other.S, room_of(ROLN_SYM_WORK));
    roln_newton_sums(now.R, now.P, 0, cut, now.J, other.S, room_of(ROLN_SYM_WORK));
    CHECK(same(MAXP * (MAXP + 1), now.S, other.S));
    CHECK(unused(MAXP * (MAXP + 1) - size, now.S + size) == MAXP * (MAXP + 1) - size);
}

static void check_step(void)
{
    const int R = now.R, P = now.P;
    ld size, e;
    CHECK(now.state.lambda > 0);
    was = now;
    CHECK_OK(step(&now));
    CHECK_ROOM();
    t_step(&was, &slow);
    size = sqrtl(dot(P, slow.d, slow.d)) + sqrtl(dot(P, slow.J + R * P, slow.J + R * P)) +
           sqrtl(dot(R, slow.r, slow.r) / slow.trace);
    e = slow.condition * size * EPS;
    BOUND("step, eps of its condition", dist(P, now.d, slow.d) / e, 0.3);
    BOUND("end of the step, eps", dist(P, now.next, slow.next) / (e + 20 * EPS), 1);
    BOUND("hope, eps", fabsl((ld)now.state.hope - slow.hope) / (slow.loss * EPS * slow.condition), 0.5);
    CHECK(same(P, now.x, was.x) && same((R + 1) * P, now.J, was.J) && same(R, now.r, was.r));
    was.state.hope = now.state.hope;
    CHECK(memcmp(&now.state, &was.state, sizeof now.state) == 0);
}

/* A step again, and one with more damping, take the sums that are there; the second is that of fresh sums. */
static void check_again(void)
{
    const int P = now.P;
    memcpy(was.d, now.d, sizeof was.d), memcpy(was.next, now.next, sizeof was.next);
    memset(now.d, 0, sizeof now.d), memset(now.next, 0, sizeof now.next);
    CHECK_OK(step(&now));
    CHECK(same(P, now.d, was.d) && same(P, now.next, was.next));
    other = now, other.state.lambda *= 4, now.state.lambda *= 4;
    CHECK_OK(step(&now));
    sums(&other);
    CHECK_OK(step(&other));
    CHECK(same(P, now.d, other.d) && same(P, now.next, other.next) && same(1, &now.state.hope, &other.state.hope));
    CHECK(!same(P, now.d, was.d));
}

static void test_step(const roln_block *t, int blocks, int R, uint64_t *s)
{
    static const roln_newton_opt opts[5] = {{1, 0, 0}, {1, ROLN_C(0.9), 0}, {ROLN_C(0.5), ROLN_C(0.5), 2}, {1, 0, 1},
                                            {ROLN_C(0.25), -ROLN_C(0.25), 5}};
    int o;
    for (o = 0; o < 5; o++) {
        problem_of(t, blocks, R, &now);
        now.opt = opts[o], now.state.lambda = o % 2 ? ROLN_C(0.01) : 1;
        now.state.taken = 3, now.state.refused = 5;
        random_point(&now, s, now.x);
        random_rows(&now, s);
        check_rows();
        check_sums();
        check_step();
        check_again();
    }
}

static void test_steps(void)
{
    static const int counts[] = {1, 7, 30, 61, 62, 63, 129, 300}, wides[] = {5, 129, 190, 191, 192, 400};
    uint64_t s = 1;
    int i;
    for (i = 0; i < 8; i++) test_step(TABLE(table), counts[i], &s);
    for (i = 0; i < 6; i++) test_step(TABLE(wide), wides[i], &s);
    for (i = 0; i < 8; i++) test_step(TABLE(flat), counts[i], &s);
}

/* ---- problems with a known end ---------------------------------------------------------------- */

/* Residuals of `now` at x, and their rows in J unless it is NULL. */
typedef void (*measure)(const problem *g, const roln_real *x, roln_real *r, roln_real *J);

/* One step of the problem, as its user takes it; lambda > 0 is set, 0 is chosen by judge. What judge says. */
static int advance(problem *g, measure f, roln_real lambda)
{
    roln_real r[MAXR];
    int taken, i;
    f(g, g->x, g->r, g->J);
    if (lambda > 0) g->state.lambda = lambda;
    CHECK_OK(rows(g));
    sums(g);
    CHECK_OK(step(g));
    f(g, g->next, r, NULL);
    taken = roln_newton_judge(g->R, r, &g->state);
    if (taken) memcpy(g->x, g->next, sizeof g->x);
    for (i = 0; i < g->P; i++) g->J[g->R * g->P + i] = taken ? g->d[i] : 0;
    return taken;
}

/* b - A x. */
static roln_real linear_A[MAXR * 12], linear_b[MAXR];
static void linear(const problem *g, const roln_real *x, roln_real *r, roln_real *J)
{
    int k;
    for (k = 0; k < g->R; k++) r[k] = linear_b[k] - roln_dot(12, linear_A + k * 12, x);
    if (J) memcpy(J, linear_A, (size_t)(g->R * 12) * sizeof *J);
}

/* The least-squares solution, or where there are many the one that is nearest to x; the condition of J J^T or J^T J, about. */
static ld t_linear(int R, const roln_real *x, ld *y)
{
    static ld K[144], C[144];
    ld A[12 * 12], rest[MAXR], row[12], top = 0, inverse = 0;
    const int P = 12, side = ROLN_MIN(R, P);
    int i, j, k;
    widen(P, x, row);
    for (k = 0; k < R; k++)
        for (rest[k] = (ld)linear_b[k], i = 0; i < P; i++) rest[k] -= (ld)linear_A[k * P + i] * row[i];
    for (i = 0; i < side; i++)
        for (j = 0; j < side; j++) {
            ld sum = 0;
            for (k = 0; k < (R < P ? P : R); k++)
                sum += R < P ? (ld)linear_A[i * P + k] * (ld)linear_A[j * P + k]
                             : (ld)linear_A[k * P + i] * (ld)linear_A[k * P + j];
            K[i * side + j] = C[i * side + j] = sum, A[i * side + j] = i == j;
        }
    for (i = 0; i < P; i++)
        for (y[i] = 0, k = 0; k < R && R >= P; k++) y[i] += (ld)linear_A[k * P + i] * rest[k];
    t_solve(side, 1, K, R < P ? rest : y);
    for (i = 0; i < P; i++) {
        for (k = 0; k < R && R < P; k++) y[i] += (ld)linear_A[k * P + i] * rest[k];
        y[i] += row[i];
    }
    for (i = 0; i < side; i++) top += C[i * (side + 1)];
    t_solve(side, side, C, A);
    for (i = 0; i < side; i++) inverse += A[i * (side + 1)];
    return top * inverse;
}

/* A linear problem of full rank: the solution in one step, in more rows than parameters, as many, fewer. */
static void test_linear(void)
{
    static const int counts[] = {1, 5, 11, 12, 13, 40, 300};
    uint64_t s = 2;
    int c, i, rep;
    for (c = 0; c < 7; c++)
        for (rep = 0; rep < 5; rep++) {
            const int R = counts[c];
            ld y[12], e, size;
            problem_of(TABLE(flat), R, &now);
            fill(R * 12, 1, &s, linear_A), fill(R, 1, &s, linear_b), fill(12, 1, &s, now.x);
            now.state.lambda = 0;
            e = t_linear(R, now.x, y) * EPS, size = 1 + sqrtl(dot(12, y, y));
            CHECK(advance(&now, linear, 0) == 1);
            BOUND("linear problem, eps of its condition", dist(12, now.x, y) / (size * e), 1);
            BOUND("gain of a linear problem - 1", fabsl((ld)now.state.gain - 1) / e, 1);
            CHECK(now.state.lambda == 0 && now.state.taken == 1 && now.state.refused == 0);
            fill(12, 0, &s, now.J + R * 12); /* again, from there: nowhere else */
            linear(&now, now.x, now.r, now.J);
            CHECK_OK(rows(&now));
            sums(&now);
            CHECK_OK(step(&now));
            for (i = 0; i < 12; i++) BOUND("second step", fabsl((ld)now.d[i]) / (size * e), 1);
        }
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

/* Steps with next to no damping: the length of the residuals is about squared every time, till rounding ends it. */
static void check_quadratic(const char *what, measure f, ld factor, ld rounding)
{
    const ld lambda = sqrtl(EPS) / 64;
    ld e[12];
    int k, fast = 0;
    for (k = 0; k < 12; k++) {
        f(&now, now.x, now.r, now.J);
        e[k] = sqrtl((ld)roln_dot(now.R, now.r, now.r));
        if (k > 0) {
            BOUND(what, e[k] / (factor * e[k - 1] * e[k - 1] + 8 * sqrtl(EPS) * e[k - 1] + rounding * EPS), 1);
            fast += e[k] < 0.1L * e[k - 1];
        }
        memset(now.J + now.R * now.P, 0, (size_t)now.P * sizeof *now.J);
        now.state.lambda = (roln_real)lambda;
        CHECK_OK(rows(&now));
        sums(&now);
        CHECK_OK(step(&now));
        memcpy(now.x, now.next, sizeof now.x);
    }
    CHECK(fast >= PICK(2, 3));
    BOUND("residuals in the end, of their rounding", e[11] / (rounding * EPS), 1);
}

/* From further away, with damping as it comes: taken and refused steps. */
static void check_default(const char *what, measure f, int most, ld rounding)
{
    const roln_newton start = ROLN_NEWTON_START;
    ld last = 0;
    int k, taken = 0;
    now.state = start;
    for (k = 0; k < most; k++) {
        taken += advance(&now, f, 0);
        if (k == most - 1) f(&now, now.x, now.r, NULL), last = sqrtl((ld)roln_dot(now.R, now.r, now.r));
    }
    CHECK((int)now.state.taken == taken && (int)now.state.refused == most - taken);
    BOUND(what, last / (rounding * EPS), 1);
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
        check_default("Rayleigh quotient from afar", rayleigh, 40, 40);
    }
}

static void test_toys(void)
{
    static const roln_block pair[] = {{&roln_biorthogonal, 2, 4, 0}};
    static const int counts[] = {FORMS, 23, 15}; /* more equations than unknowns; more than dimensions; fewer than those */
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
            check_default("forms as it comes", forms, 40, 400);
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
        check_default("projector as it comes", projector, 40, 10);
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
static const roln_block walled[] = {{ROLN_EUCLIDEAN, 1, 1, 0}, {&wall, 1, 3, 0}};

/* `now` but for d, next and S is `was`. */
static int unchanged(void)
{
    return same(MAXP, now.x, was.x) && same((MAXR + 1) * MAXP, now.J, was.J) && same(MAXR, now.r, was.r) &&
           memcmp(&now.state, &was.state, sizeof now.state) == 0;
}

/* Point and state after a refusal of the rows, of which nothing is promised. */
static int kept(void)
{
    return same(MAXP, now.x, was.x) && memcmp(&now.state, &was.state, sizeof now.state) == 0;
}

/* Every number of the rows and of the last step, every residual, the cap; what a manifold says; a metric of its own. */
static void test_rows_status(void)
{
    static const roln_block modal[] = {{ROLN_EUCLIDEAN, 1, 2, 0}, {&mode, 1, MASSES, 0}};
    static const roln_real bad[] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    uint64_t s = 5;
    int i, b;
    problem_of(TABLE(table), 7, &now);
    point_of_table(&s, now.x);
    random_rows(&now, &s);
    now.opt.cap = 2, now.state.loss = 3, now.state.bound = 4;
    was = now;
    for (i = 0; i < 8 * SIZE + 7 + 2; i++)
        for (b = 0; b < 3; b++) {
            now = was;
            if (i < 8 * SIZE) now.J[i] = bad[b];
            else if (i < 8 * SIZE + 7) now.r[i - 8 * SIZE] = bad[b];
            else if (i == 8 * SIZE + 7) now.opt.cap = bad[b];
            else now.r[b] = PICK(1e30f, 1e300); /* its square is not finite */
            CHECK(rows(&now) == ROLN_E_NOT_FINITE);
            CHECK(kept());
        }
    now = was, now.x[AT_S] = -1, other = now;
    CHECK(rows(&now) == ROLN_E_NOT_SPD && same(SIZE, now.x, other.x) && memcmp(&now.state, &was.state, sizeof was.state) == 0);
    now = was, memset(now.x + AT_B2, 0, 12 * sizeof *now.x), other = now;
    CHECK(rows(&now) == ROLN_E_ILL_CONDITIONED && same(SIZE, now.x, other.x));
    CHECK(memcmp(&now.state, &was.state, sizeof was.state) == 0);
    problem_of(TABLE(modal), 7, &now);
    random_point(&now, &s, now.x), random_rows(&now, &s);
    was = now;
    CHECK(rows(&now) == ROLN_E_SHAPE && kept());
}

/* Settings that are none, too little damping, retractions that fail: nothing has changed. */
static void test_step_status(void)
{
    static const roln_real bad[] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, -1};
    static const int counts[] = {40, 7}; /* primal, dual */
    uint64_t s = 6;
    int c, i, b;
    for (c = 0; c < 2; c++) {
        problem_of(TABLE(few), counts[c], &now);
        random_point(&now, &s, now.x), random_rows(&now, &s);
        now.state.taken = 1, now.state.hope = 2, now.state.gain = 3;
        CHECK_OK(rows(&now));
        sums(&now);
        was = now;
        for (i = 0; i < 3; i++)
            for (b = 0; b < (i == 0 ? 4 : 3); b++) {
                now = was;
                *(i == 0 ? &now.state.lambda : i == 1 ? &now.opt.rate : &now.opt.momentum) = bad[b];
                other = now;
                CHECK(step(&now) == ROLN_E_NOT_FINITE);
                CHECK(memcmp(&now.state, &other.state, sizeof now.state) == 0);
                now.state = was.state;
                CHECK(unchanged());
            }
        for (i = 0; i < 2; i++) { /* a step beyond all numbers; one that ends there on free numbers alone */
            now = was;
            now.opt.rate = PICK(3e38f, 1e308);
            if (i) now.table += 3, now.blocks = 1;
            CHECK(step(&now) != ROLN_OK && unchanged());
            now.opt = was.opt, now.table = was.table, now.blocks = was.blocks;
        }
        now = was;
        for (i = 0; i < (now.R + 1) * now.P; i++) now.J[i] = 0; /* no rows at all: no damping is enough */
        sums(&now);
        was = now;
        CHECK(step(&now) == ROLN_E_NOT_SPD && unchanged());
    }
}

/* J has lost rank, exactly: without damping a status, with little as much as it takes; steps that are too long for a retraction
   likewise. lambda keeps what it took. */
static void test_damping(void)
{
    static const int counts[] = {16, 3}; /* primal, dual */
    roln_real lambda;
    int c, i;
    for (c = 0; c < 2; c++) {
        problem_of(TABLE(walled), counts[c], &now);
        for (i = 0; i < now.R * 4; i++) now.J[i] = c == 0 && i % 4 > 1 ? (roln_real)(i % 7) : 1; /* sums of 16 and 4: exact roots */
        for (i = 0; i < now.R; i++) now.r[i] = (roln_real)i + 1;
        now.x[3] = 1000; /* far */
        CHECK_OK(rows(&now));
        sums(&now);
        now.state.lambda = 0, was = now;
        CHECK(step(&now) == ROLN_E_NOT_SPD && unchanged());
        now.state.lambda = lambda = PICK(1e-20f, 1e-30);
        CHECK_OK(step(&now));
        CHECK(now.state.lambda > lambda && now.state.lambda < 64 * ROLN_EPS);
        for (; lambda < now.state.lambda; lambda *= 8) {}
        CHECK(lambda == now.state.lambda);
        now.state = was.state, now.state.hope = was.state.hope;
        CHECK(unchanged());
        /* |d| falls with damping, 1 / s in the end */
        problem_of(TABLE(walled), counts[c], &now);
        for (i = 0; i < now.R; i++) now.J[4 * i + 1] = 1, now.r[i] = 8; /* d = 8 R / (R + lambda R / 4) */
        now.x[3] = ROLN_C(0.25);
        CHECK_OK(rows(&now));
        sums(&now);
        now.state.lambda = ROLN_C(0.125), was = now;
        CHECK_OK(step(&now));
        CHECK(now.state.lambda == 512); /* 64: 8 / 17 */
        CHECK_NEAR(now.d[1], 8.0 / 129, 8 * EPS);
        CHECK_NEAR(now.next[1], 8.0 / 129, 8 * EPS);
        other = now, now = was; /* a last step that is too long by itself: it is dropped */
        now.opt.momentum = ROLN_C(0.9), now.J[4 * now.R + 1] = 7;
        CHECK_OK(step(&now));
        CHECK(now.state.lambda == 512 && same(4, now.d, other.d) && same(4, now.next, other.next));
        now.opt.momentum = ROLN_C(0.0078125); /* and one that is not stays */
        CHECK_OK(step(&now));
        CHECK(now.state.lambda == 512 && !same(4, now.d, other.d));
        now = was, now.state.lambda = 0, now.J[0] = 1;
        for (i = 1; i < now.R; i++) now.J[4 * i + i % 4] += 1; /* of full rank */
        if (c == 0) continue;
        sums(&now);
        was = now;
        CHECK(step(&now) == ROLN_E_ILL_CONDITIONED && unchanged()); /* no damping is ever added */
        now.state.lambda = was.state.lambda = 1, now.x[3] = was.x[3] = -1;
        CHECK(step(&now) == ROLN_E_ILL_CONDITIONED && unchanged()); /* none helps */
    }
}

/* What the residuals say of a step: loss 4 at its beginning, hope 2. */
static void test_judge(void)
{
    static const struct {
        double loss, gain;
        int take;
        double factor;
    } cases[] = {{2, 1, 1, 1 / 3.0},     {0.5, 1.75, 1, 1 / 3.0}, {2.49, 0.755, 1, 1 / 3.0}, {2.51, 0.745, 1, 1},
                 {3.49, 0.255, 1, 1},    {3.51, 0.245, 1, 2},     {3.99, 0.005, 1, 2},       {4, 0, 0, 4},
                 {5, 0, 0, 4},           {NAN, 0, 0, 4},          {INFINITY, 0, 0, 4}};
    const roln_newton start = {ROLN_C(0.5), 0, 4, 2, 9, 10, 20};
    roln_newton g;
    roln_real r[3];
    int i, hope;
    for (i = 0; i < 11; i++)
        for (hope = 0; hope < 4; hope++) {
            const int take = cases[i].take && hope == 0;
            g = start;
            if (hope > 0) g.hope = hope == 1 ? 0 : hope == 2 ? -1 : (roln_real)NAN;
            r[0] = (roln_real)sqrt(cases[i].loss), r[1] = r[2] = 0;
            CHECK(roln_newton_judge(3, r, &g) == take);
            CHECK_NEAR(g.gain, take ? cases[i].gain : 0, 20 * EPS);
            CHECK_NEAR(g.lambda, 0.5 * (take ? cases[i].factor : 4), 2 * EPS);
            CHECK(g.taken == 10 + (uint32_t)take && g.refused == 20 + (uint32_t)!take);
            CHECK(g.loss == 4 && g.bound == 0);
        }
    /* one residual that is none; beyond the bound they count 2 bound |r| - bound^2 */
    g = start, r[0] = r[1] = 0, r[2] = (roln_real)NAN;
    CHECK(roln_newton_judge(3, r, &g) == 0 && g.refused == 21);
    g = start, g.bound = ROLN_C(0.5), r[0] = 2, r[1] = -ROLN_C(0.25), r[2] = -1; /* 1.75 + 0.0625 + 0.75 */
    CHECK(roln_newton_judge(3, r, &g) == 1);
    CHECK_NEAR(g.gain, (4 - 2.5625) / 2, 4 * EPS);
    /* no damping stays none; damping has an end on both sides */
    g = start, g.lambda = 0;
    CHECK(roln_newton_judge(3, r, &g) == 0 && g.lambda == 0);
    r[0] = r[2] = 0;
    CHECK(roln_newton_judge(3, r, &g) == 1 && g.lambda == 0);
    for (g.lambda = 1, i = 0; i < 200; i++) g.loss = g.hope = 1, roln_newton_judge(3, r, &g);
    CHECK(g.lambda == ROLN_EPS);
    for (i = 0; i < 2000; i++) g.loss = 0, roln_newton_judge(3, r, &g);
    CHECK(roln_finite(g.lambda) && g.lambda >= 1 / ROLN_EPS);
}

/* ---- many steps ------------------------------------------------------------------------------- */

/* A pair after 100,000 steps of a few random rows with momentum; the encoder undoes the decoder still. */
static void test_pair(void)
{
    static const roln_block pair[] = {{&roln_biorthogonal, 2, 4, 0}};
    uint64_t s = 7;
    ld top = 0, moved = 0;
    int k, i, ok = 1;
    problem_of(TABLE(pair), 3, &now);
    now.opt.momentum = ROLN_C(0.9), now.opt.cap = 3, now.state.lambda = ROLN_C(0.1);
    random_point(&now, &s, now.x);
    for (k = 0; k < 100000; k++) {
        for (i = 0; i < 3 * 16; i++) now.J[i] = roln_uniform(&s) - ROLN_C(0.5);
        for (i = 0; i < 3; i++) now.r[i] = ROLN_C(0.05) * (roln_uniform(&s) - ROLN_C(0.5));
        ok &= roln_newton_rows(now.blocks, now.table, &now.opt, 3, now.x, now.J, now.r, &now.state, room) == ROLN_OK;
        roln_newton_sums(3, 16, 0, 3, now.J, now.S, room);
        ok &= roln_newton_step(now.blocks, now.table, &now.opt, &(roln_newton_system){3, 16, now.J, now.r, now.S}, now.x,
                               &now.state, now.d, now.next, room) == ROLN_OK;
        memcpy(now.x, now.next, 16 * sizeof *now.x), memcpy(now.J + 3 * 16, now.d, 16 * sizeof *now.d);
        if (k % 100 == 99) {
            const ld d = defect(2, 4, now.x) / EPS;
            if (!(d <= top)) top = d;
            moved += (ld)ROLN_SQRT(roln_dot(16, now.d, now.d));
        }
    }
    CHECK(ok && moved > 10);
    BOUND("Psi^T Phi - I after 100,000 steps, eps", top, 2);
}

/* The table, 3,000 steps: on every manifold still. */
static void test_table(void)
{
    uint64_t s = 8;
    ld start[SIZE], moved = 0;
    int k, i, b;
    problem_of(TABLE(table), 5, &now);
    now.opt.momentum = ROLN_C(0.9), now.state.lambda = ROLN_C(0.1);
    point_of_table(&s, now.x);
    widen(SIZE, now.x, start);
    for (k = 0; k < 3000; k++) {
        fill(5 * SIZE, 1, &s, now.J), fill(5, 0.05L, &s, now.r);
        CHECK_OK(rows(&now));
        sums(&now);
        CHECK_OK(step(&now));
        memcpy(now.x, now.next, sizeof now.x), memcpy(now.J + 5 * SIZE, now.d, SIZE * sizeof *now.d);
        BOUND("pair, eps", defect(2, 5, now.x + AT_B) / EPS, 4);
        BOUND("rows of a Stiefel matrix, eps", skewness(2, 4, now.x + AT_T) / EPS, 6);
        BOUND("length on the sphere, eps", skewness(1, 3, now.x + AT_U) / EPS, 6);
        for (b = 0; b < 9; b++) CHECK(now.x[AT_S + b] == now.x[AT_S + b % 3 * 3 + b / 3]);
    }
    for (i = 0; i < SIZE; i++) moved += fabsl((ld)now.x[i] - start[i]) > 0.1L;
    CHECK(moved > SIZE / 2);
}

static void test_walks(void)
{
    test_pair();
    test_table();
}

/* ---- the shell at work ------------------------------------------------------------------------ */

enum { POSES = 120 };
static roln_real pose_q[2 * POSES], pose_qd[2 * POSES], pose_qdd[2 * POSES], pose_tau[2 * POSES];

/* Two uniform rods of 1 kg and 1 m, the first angle from hanging, the second from the first: M qdd = tau - c - g. */
static void two_links(uint64_t *s)
{
    int k, i;
    for (k = 0; k < POSES; k++) {
        roln_real *q = pose_q + 2 * k, *qd = pose_qd + 2 * k, *tau = pose_tau + 2 * k;
        double a, b, M11, M12, f1, f2, det;
        for (i = 0; i < 2; i++) {
            q[i] = 3 * roln_uniform(s) - ROLN_C(1.5), qd[i] = 4 * roln_uniform(s) - 2;
            tau[i] = 10 * roln_uniform(s) - 5;
        }
        a = (double)q[0], b = (double)q[1], M11 = 5.0 / 3 + cos(b), M12 = 1.0 / 3 + cos(b) / 2;
        f1 = (double)tau[0] + sin(b) / 2 * (2 * (double)qd[0] + (double)qd[1]) * (double)qd[1] -
             9.81 * (1.5 * sin(a) + sin(a + b) / 2);
        f2 = (double)tau[1] - sin(b) / 2 * (double)qd[0] * (double)qd[0] - 9.81 * sin(a + b) / 2;
        det = M11 / 3 - M12 * M12;
        pose_qdd[2 * k] = (roln_real)((f1 / 3 - M12 * f2) / det), pose_qdd[2 * k + 1] = (roln_real)((M11 * f2 - M12 * f1) / det);
    }
}

static const roln_newton begin = ROLN_NEWTON_START;
static const roln_newton_opt usual = ROLN_NEWTON_OPT;

/* Mean of |zdd_pred - zdd|^2 over all poses, as the gradient sums it. */
static ld pose_error(const arm_params *p, const roln_loss *weights, arm_train *train)
{
    static arm_gradient g;
    const roln_batch all = {.count = POSES, .stride = 1, .q = pose_q, .qd = pose_qd, .qdd = pose_qdd, .tau = pose_tau};
    memset(&g, 0, sizeof g);
    CHECK_OK(arm_grad_acc(p, weights, &all, &g, train));
    return (ld)g.loss.zdd / POSES;
}

/* Two links from random weights: the mean square of the errors of acceleration falls by 10,000. */
static void check_learning(int count, roln_real momentum, int steps, uint64_t s)
{
    static const roln_loss weights = {.zdd = 1};
    static arm_start init;
    static arm_params p;
    static arm_residuals g;
    static arm_newton o;
    static arm_train train;
    static int start[360];
    roln_batch b = {.count = count, .stride = 1, .start = start, .q = pose_q, .qd = pose_qd, .qdd = pose_qdd, .tau = pose_tau};
    roln_newton_opt opt = usual;
    roln_real qbar[2];
    ld first;
    int k, i;
    two_links(&s);
    CHECK_OK(arm_init_pod(&p, POSES, pose_q, pose_qd, qbar, &s, &init));
    memset(&g, 0, sizeof g), memset(&o, 0, sizeof o);
    o.state = begin, opt.momentum = momentum, g.seed = s;
    first = pose_error(&p, &weights, &train);
    for (k = 0; k < steps; k++, g.seed += (uint64_t)count) {
        for (i = 0; i < count; i++) start[i] = (k * count + i) % POSES;
        CHECK_OK(arm_rows(&p, &weights, &b, 1, 0, 0, &g, &train));
        CHECK_OK(arm_newton_rows(&p, &opt, count, &g, &o));
        arm_newton_sums(count, 0, arm_newton_side, &g, &o, o.work.sums);
        CHECK_OK(arm_newton_step(&p, &opt, count, &g, &o));
        (void)arm_rows(&o.next, &weights, &b, 1, 0, 1, &g, &train); /* a model that fails there is refused */
        (void)arm_newton_judge(&p, count, &g, &o);
    }
    CHECK((int)(o.state.taken + o.state.refused) == steps && o.state.refused > 0);
    BOUND("two links, loss, last / first", pose_error(&p, &weights, &train) / first, 1e-4L);
}

static void test_learning(void)
{
    uint64_t s;
    for (s = 1; s <= 2; s++) {
        check_learning(360, 0, 60, s); /* primal */
        check_learning(120, ROLN_C(0.9), 100, s); /* dual */
    }
}

/* Two oscillators seen through five channels, and inputs that do nothing. */
enum { SEEN = 300, COUNT = 230, DUAL = 40 };
static roln_real seen_q[5 * SEEN], seen_qd[5 * SEEN], seen_u[2 * SEEN];
static int seen_start[COUNT];
static const roln_real tick = ROLN_C(0.05);

static void oscillators(uint64_t *s)
{
    int k, c;
    for (k = 0; k < SEEN; k++)
        for (c = 0; c < 5; c++) {
            const double a = cos(k * 0.05), ad = -sin(k * 0.05), b = sin(k * 0.07 + 1), bd = 1.4 * cos(k * 0.07 + 1);
            const double e = 0.4 * (c - 2), f = 0.6 * (c % 3 - 1), odd = c % 2;
            seen_q[k * 5 + c] = (roln_real)(e * a + f * b + 0.1 * a * a * odd);
            seen_qd[k * 5 + c] = (roln_real)(e * ad + f * bd + 0.2 * a * ad * odd);
            if (c < 2) seen_u[k * 2 + c] = roln_uniform(s) - ROLN_C(0.5);
        }
    for (k = 0; k < COUNT; k++) seen_start[k] = roln_randint(SEEN - 3, s);
}

/* All that a learning hand keeps. */
typedef struct {
    hand_params p;
    hand_residuals g;
    hand_newton o;
} hand_all;
static hand_all hand_a, hand_b;
static hand_train hand_scratch;
static const roln_loss hand_weights = ROLN_ODE_WEIGHTS;

static roln_batch hand_batch(int from, int count)
{
    const roln_batch b = {
        .count = count, .steps = 3, .stride = 1, .start = seen_start + from, .q = seen_q, .qd = seen_qd, .tau = seen_u};
    return b;
}

static void hand_begin(hand_all *h, uint64_t s)
{
    static hand_start init;
    roln_real qbar[5];
    memset(h, 0, sizeof *h);
    oscillators(&s);
    CHECK_OK(hand_init_pod(&h->p, SEEN, seen_q, seen_qd, qbar, &s, &init));
    h->o.state = begin, h->g.seed = s;
}

/* A step up to where judge decides. */
static void hand_try(hand_all *h, const roln_newton_opt *opt, int count)
{
    const roln_batch b = hand_batch(0, count);
    CHECK_OK(hand_rows(&h->p, &hand_weights, &b, tick, 0, 0, &h->g, &hand_scratch));
    CHECK_OK(hand_newton_rows(&h->p, opt, count, &h->g, &h->o));
    hand_newton_sums(count, 0, hand_newton_side, &h->g, &h->o, h->o.work.sums);
    CHECK_OK(hand_newton_step(&h->p, opt, count, &h->g, &h->o));
    (void)hand_rows(&h->o.next, &hand_weights, &b, tick, 0, 1, &h->g, &hand_scratch);
}

static void hand_learn(hand_all *h, const roln_newton_opt *opt, int count, int steps)
{
    for (; steps > 0; steps--, h->g.seed += 1000) {
        hand_try(h, opt, count);
        (void)hand_newton_judge(&h->p, count, &h->g, &h->o);
    }
}

static ld hand_error(const hand_params *p)
{
    static hand_gradient g;
    const roln_batch b = hand_batch(0, COUNT);
    memset(&g, 0, sizeof g);
    CHECK_OK(hand_grad(p, &hand_weights, &b, tick, &g, &hand_scratch));
    return (ld)roln_loss_total(&hand_weights, &g.loss) / COUNT;
}

/* Every pair, and that the encoder undoes the decoder. */
static void check_hand(const hand_params *p)
{
    static hand_work work;
    hand_latent z = {{ROLN_C(0.25), -ROLN_C(0.5)}, {ROLN_C(0.125), ROLN_C(0.75)}}, y;
    hand_state x;
    int i;
    BOUND("pairs of the hand, eps", defect(4, 5, p->theta) / EPS, 2);
    BOUND("pairs of the hand, eps", defect(2, 4, p->theta + 45) / EPS, 2);
    CHECK_OK(hand_decode(p, &z, &x, &work));
    CHECK_OK(hand_encode(p, &x, &y, &work));
    for (i = 0; i < 2; i++) BOUND("left inverse, eps", (fabsl((ld)(y.z[i] - z.z[i])) + fabsl((ld)(y.zd[i] - z.zd[i]))) / EPS, 20);
}

/* Windows of the whole model, autoencoder and all: it learns; 6 steps and 6 more, from copies of what is said to be enough, are
   12. */
static void check_resume(int count, roln_real momentum)
{
    roln_newton_opt opt = usual;
    ld first;
    opt.momentum = momentum;
    hand_begin(&hand_a, 11);
    first = hand_error(&hand_a.p);
    hand_learn(&hand_a, &opt, count, 6);
    memset(&hand_b, 0, sizeof hand_b);
    hand_b.p = hand_a.p, hand_b.o.state = hand_a.o.state, hand_b.g.seed = hand_a.g.seed;
    memcpy(hand_b.g.J + count * hand_newton_size, hand_a.g.J + count * hand_newton_size, hand_newton_size * sizeof(roln_real));
    hand_learn(&hand_a, &opt, count, 6), hand_learn(&hand_b, &opt, count, 6);
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && memcmp(&hand_a.o.state, &hand_b.o.state, sizeof begin) == 0);
    CHECK(same(hand_newton_size, hand_a.g.J + count * hand_newton_size, hand_b.g.J + count * hand_newton_size));
    CHECK(hand_a.o.state.taken >= 6);
    BOUND("windows, loss, last / first", hand_error(&hand_a.p) / first, 0.5);
    check_hand(&hand_a.p);
}

/* Rows in pieces, sums in two halves, each verb of the shell and what it stands for; a refused step. */
static void check_hand_pieces(int count)
{
    const int side = ROLN_NEWTON_SIDE(count, hand_newton_size), cut = 7 * side / 10, P = hand_newton_size;
    static roln_real other_work[ROLN_SYM_WORK];
    const roln_newton_system system = {count, P, hand_b.g.J, hand_b.g.r, hand_b.o.S};
    roln_batch b;
    roln_newton_opt opt = usual;
    roln_real lambda;
    opt.momentum = ROLN_C(0.5);
    hand_begin(&hand_a, 12);
    hand_learn(&hand_a, &opt, count, 3);
    hand_b = hand_a;
    hand_try(&hand_a, &opt, count);
    b = hand_batch(0, 7);
    CHECK_OK(hand_rows(&hand_b.p, &hand_weights, &b, tick, 0, 0, &hand_b.g, &hand_scratch));
    b = hand_batch(7, count - 7);
    CHECK_OK(hand_rows(&hand_b.p, &hand_weights, &b, tick, 7, 0, &hand_b.g, &hand_scratch));
    CHECK_OK(roln_newton_rows(hand_blocks, hand_table, &opt, count, hand_b.p.theta, hand_b.g.J, hand_b.g.r, &hand_b.o.state, room));
    CHECK(same((count + 1) * P, hand_a.g.J, hand_b.g.J) && same(count, hand_a.g.r, hand_b.g.r));
    hand_newton_sums(count, cut, hand_newton_side, &hand_b.g, &hand_b.o, other_work);
    hand_newton_sums(count, 0, cut, &hand_b.g, &hand_b.o, hand_b.o.work.sums);
    hand_b.o.next = hand_b.p;
    CHECK_OK(roln_newton_step(hand_blocks, hand_table, &opt, &system, hand_b.p.theta, &hand_b.o.state, hand_b.o.d,
                              hand_b.o.next.theta, room));
    CHECK(same(side * (side + 1), hand_a.o.S, hand_b.o.S) && same(P, hand_a.o.d, hand_b.o.d));
    CHECK(memcmp(&hand_a.o.next, &hand_b.o.next, sizeof hand_a.o.next) == 0);
    CHECK(memcmp(&hand_a.o.state, &hand_b.o.state, sizeof hand_a.o.state) == 0);
    /* refused: residuals that are none */
    hand_b = hand_a, lambda = hand_a.o.state.lambda;
    hand_a.g.next[count - 1] = (roln_real)NAN;
    CHECK(hand_newton_judge(&hand_a.p, count, &hand_a.g, &hand_a.o) == 0);
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && same(count * P, hand_a.g.J, hand_b.g.J));
    CHECK(same(count, hand_a.g.r, hand_b.g.r) && same(side * (side + 1), hand_a.o.S, hand_b.o.S));
    CHECK(hand_a.o.state.lambda == 4 * lambda && hand_a.o.state.loss == hand_b.o.state.loss);
    CHECK(roln_dot(P, hand_a.g.J + count * P, hand_a.g.J + count * P) <= 0); /* and no momentum */
    CHECK_OK(hand_newton_step(&hand_a.p, &opt, count, &hand_a.g, &hand_a.o)); /* shorter, from the same sums */
    CHECK(roln_dot(P, hand_a.o.d, hand_a.o.d) < roln_dot(P, hand_b.o.d, hand_b.o.d));
    /* taken, now or with more damping */
    b = hand_batch(0, count);
    while (!hand_newton_judge(&hand_b.p, count, &hand_b.g, &hand_b.o) && hand_b.o.state.refused < 50) {
        CHECK_OK(hand_newton_step(&hand_b.p, &opt, count, &hand_b.g, &hand_b.o));
        (void)hand_rows(&hand_b.o.next, &hand_weights, &b, tick, 0, 1, &hand_b.g, &hand_scratch);
    }
    CHECK(hand_b.o.state.refused < 50 && hand_b.o.state.taken == hand_a.o.state.taken + 1);
    CHECK(memcmp(&hand_b.p, &hand_b.o.next, sizeof hand_b.p) == 0 && same(P, hand_b.o.d, hand_b.g.J + count * P));
}

/* The networks alone: what is in front of them stays, bit for bit; their rows are the tail of those of everything. */
static void check_palm(void)
{
    static palm_params p;
    static palm_residuals g;
    static palm_newton o;
    static palm_train train;
    const int P = palm_newton_size, ae = palm_ae_size;
    const roln_batch b = hand_batch(0, 20);
    int k, i, moved = 0;
    hand_begin(&hand_a, 13);
    memcpy(&p, &hand_a.p, sizeof p);
    CHECK(sizeof p == sizeof hand_a.p && P == hand_newton_size - ae && palm_newton_side == 20);
    memset(&g, 0, sizeof g), memset(&o, 0, sizeof o);
    o.state = begin, g.seed = hand_a.g.seed;
    CHECK_OK(hand_rows(&hand_a.p, &hand_weights, &b, tick, 0, 0, &hand_a.g, &hand_scratch));
    for (k = 0; k < 8; k++) {
        CHECK_OK(palm_rows(&p, &hand_weights, &b, tick, 0, 0, &g, &train));
        for (i = 0; i < 20 && k == 0; i++) CHECK(same(P, g.J + i * P, hand_a.g.J + i * hand_newton_size + ae));
        CHECK_OK(palm_newton_rows(&p, &usual, 20, &g, &o));
        palm_newton_sums(20, 0, palm_newton_side, &g, &o, o.work.sums);
        CHECK_OK(palm_newton_step(&p, &usual, 20, &g, &o));
        (void)palm_rows(&o.next, &hand_weights, &b, tick, 0, 1, &g, &train);
        (void)palm_newton_judge(&p, 20, &g, &o);
    }
    CHECK(o.state.taken >= 4 && same(ae, p.theta, hand_a.p.theta) && same(3, &p.scale.q, &hand_a.p.scale.q));
    for (i = ae; i < palm_theta_size; i++) moved += p.theta[i] < hand_a.p.theta[i] || p.theta[i] > hand_a.p.theta[i];
    CHECK(moved > 3 * P / 4);
}

/* Blocks and scratch of the shell are those of its table, for any number of rows. */
static void check_sizes(void)
{
    const int P = hand_newton_size, blocks = hand_blocks, Q = palm_newton_size, from = palm_newton_from, R = COUNT;
    int verb = 0, count, b;
    for (b = 0; b < blocks; b++)
        if (hand_table[b].manifold != ROLN_EUCLIDEAN && roln_block_size(hand_table + b) > 0)
            verb = ROLN_MAX(verb, hand_table[b].manifold->work(hand_table[b].rows, hand_table[b].cols));
    CHECK(hand_newton_from == 0 && hand_newton_first == 0 && hand_newton_blocks == blocks);
    CHECK(roln_product_size(blocks, hand_table) == P && P == hand_theta_size);
    CHECK(roln_product_size(palm_newton_first, palm_table) == from && from == palm_ae_size);
    CHECK(roln_product_size(palm_newton_blocks, palm_table + palm_newton_first) == Q);
    CHECK((int)(sizeof hand_a.o.work.rows / sizeof(roln_real)) == verb);
    CHECK((int)(sizeof hand_a.o.work.step / sizeof(roln_real)) == ROLN_NEWTON_STEP_WORK(R, P, verb));
    for (count = 1; count < R; count++)
        CHECK(ROLN_NEWTON_STEP_WORK(count, P, verb) <= ROLN_NEWTON_STEP_WORK(R, P, verb));
}

/* Counts that do not fit: a status, and nothing is touched. */
static void check_lengths(void)
{
    static const int wrong[][3] = {{-1, 1, 3}, {COUNT, 1, 3}, {COUNT - 4, 5, 3}, {0, COUNT + 1, 3}, {0, -1, 3},
                                   {0, 1, 4}, {0, 1, -1}};
    int i, again;
    hand_begin(&hand_a, 14);
    hand_learn(&hand_a, &usual, DUAL, 1);
    hand_b = hand_a;
    for (i = 0; i < 7; i++)
        for (again = 0; again < 2; again++) { /* at, count, steps */
            roln_batch b = hand_batch(0, wrong[i][1]);
            b.steps = wrong[i][2];
            CHECK(hand_rows(&hand_a.p, &hand_weights, &b, tick, wrong[i][0], again, &hand_a.g, &hand_scratch) == ROLN_E_LENGTH);
        }
    for (i = 0; i < 3; i++) {
        const int count = i == 0 ? -1 : i == 1 ? 0 : COUNT + 1;
        CHECK(hand_newton_rows(&hand_a.p, &usual, count, &hand_a.g, &hand_a.o) == ROLN_E_LENGTH);
        CHECK(hand_newton_step(&hand_a.p, &usual, count, &hand_a.g, &hand_a.o) == ROLN_E_LENGTH);
        CHECK(hand_newton_judge(&hand_a.p, count, &hand_a.g, &hand_a.o) == 0);
    }
    CHECK(memcmp(&hand_a.p, &hand_b.p, sizeof hand_a.p) == 0 && memcmp(&hand_a.g, &hand_b.g, sizeof hand_a.g) == 0);
    CHECK(memcmp(&hand_a.o.state, &hand_b.o.state, sizeof begin) == 0);
}

static void test_shell(void)
{
    check_sizes();
    check_lengths();
    check_resume(COUNT, 0);
    check_resume(DUAL, ROLN_C(0.9));
    check_hand_pieces(COUNT);
    check_hand_pieces(DUAL);
    check_palm();
}

void TEST_NAME(newton)(void)
{
    test_steps();
    test_linear();
    test_rayleigh();
    test_toys();
    test_rows_status();
    test_step_status();
    test_damping();
    test_judge();
    test_walks();
    test_learning();
    test_shell();
    print_bounds();
}
