/* SPDX-License-Identifier: MIT */
/* test_lbfgs.c - limited-memory BFGS: quadratic and curved valleys, subspaces on the Stiefel manifold, biorthogonal and SPD blocks,
   what it refuses. */
#include <math.h>
#include <string.h>

#include "check.h"
#include "roln_riem.h"
#include "room.h"

enum { M = 6, MOST = 64, TRIES_MOST = 40 };

typedef struct {
    int calls, n, k;
    roln_real A[MOST]; /* [n][n] */
    int bad_from;      /* calls from this on give NaN; 0: none */
    int bad_gradient;  /* ... only a NaN gradient */
} problem;

static int is_bad(problem *p)
{
    return p->bad_from > 0 && ++p->calls >= p->bad_from;
}

static roln_real not_a_number(void)
{
    const roln_bits b = ~(roln_bits)0;
    roln_real x;
    memcpy(&x, &b, sizeof x);
    return x;
}

/* Rosenbrock's valley of n numbers. */
static roln_real valley(void *ctx, const roln_real *x, roln_real *g)
{
    problem *p = ctx;
    roln_real f = 0;
    int i;
    for (i = 0; i + 1 < p->n; i++) {
        const roln_real a = x[i + 1] - x[i] * x[i], b = 1 - x[i];
        f += 100 * a * a + b * b;
        g[i] += -400 * a * x[i] - 2 * b;
        g[i + 1] += 200 * a;
    }
    if (is_bad(p)) {
        if (!p->bad_gradient) return not_a_number();
        g[0] = not_a_number();
    }
    return f;
}

/* -tr X A X^T of X [k][n]: least on the span of the eigenvectors of the k largest eigenvalues. */
static roln_real subspace(void *ctx, const roln_real *x, roln_real *g)
{
    const problem *p = ctx;
    roln_real f = 0, y[8];
    int r, i;
    for (r = 0; r < p->k; r++) {
        roln_mm(1, p->n, p->n, x + r * p->n, p->A, y);
        f -= roln_dot(p->n, x + r * p->n, y);
        for (i = 0; i < p->n; i++)
            g[r * p->n + i] -= 2 * y[i];
    }
    return f;
}

/* |x - A|^2: the point of a manifold nearest to A. */
static roln_real nearest(void *ctx, const roln_real *x, roln_real *g)
{
    const problem *p = ctx;
    roln_real f = 0;
    int i;
    for (i = 0; i < p->n; i++) {
        const roln_real d = x[i] - p->A[i];
        f += d * d, g[i] += 2 * d;
    }
    return f;
}

static void symmetric(int n, uint64_t *seed, roln_real *A)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++)
            A[i * n + j] = A[j * n + i] = roln_normal(seed);
}

/* Steps until one is refused, `most` at most; each lowers the value. Returns the last status. */
static roln_status minimise(const roln_block *table, int blocks, roln_value value, problem *p, int most, int verb,
                            roln_lbfgs *state, roln_real *x)
{
    static roln_real keep[ROLN_LBFGS_KEEP(M, MOST)];
    const int P = roln_product_size(blocks, table);
    roln_status st = ROLN_OK;
    roln_real before = 0;
    int t;
    for (t = 0; t < most && st == ROLN_OK; t++) {
        st = roln_lbfgs_step(blocks, table, M, value, p, state, x, keep, room_of(ROLN_LBFGS_WORK(M, P, verb)));
        CHECK_BELOW(room_used(), room_end);
        if (t > 0 && st == ROLN_OK) CHECK(state->value < before);
        before = state->value;
    }
    return st;
}

static void test_valley(void)
{
    static const roln_block flat[] = {{ROLN_EUCLIDEAN, 2, 3, 0}, {ROLN_EUCLIDEAN, 0, 3, 0}, {ROLN_EUCLIDEAN, 1, 4, 0}};
    problem p = {0};
    roln_lbfgs state = ROLN_LBFGS_START;
    roln_real x[10] = {0};
    roln_status st;
    int i;
    p.n = 10;
    st = minimise(flat, 3, valley, &p, 400, 0, &state, x);
    CHECK(st == ROLN_OK || st == ROLN_E_NO_CONVERGENCE);
    CHECK_BELOW(state.value, ROLN_EPS);
    for (i = 0; i < 10; i++)
        CHECK_NEAR(x[i], 1, 64 * sqrt((double)ROLN_EPS));
    CHECK(state.t > 20);
}

/* With enough pairs a quadratic of n numbers takes about n steps; along -g alone it takes hundreds. */
static roln_real bowl(void *ctx, const roln_real *x, roln_real *g)
{
    const problem *p = ctx;
    roln_real f = 0;
    int i;
    for (i = 0; i < p->n; i++)
        f += p->A[i] * x[i] * x[i], g[i] += 2 * p->A[i] * x[i];
    return f;
}

static void test_bowl(void)
{
    static const roln_block flat[] = {{ROLN_EUCLIDEAN, 1, 5, 0}};
    problem p = {0};
    roln_lbfgs state = ROLN_LBFGS_START;
    roln_real x[5];
    int i;
    p.n = 5;
    for (i = 0; i < 5; i++)
        p.A[i] = ROLNI_AS(roln_real, i == 0 ? 1 : 4 * p.A[i - 1]), x[i] = 1;
    minimise(flat, 1, bowl, &p, 30, 0, &state, x);
    CHECK_BELOW(state.value, 1e-6);
}

static void test_subspace(void)
{
    static const roln_block stiefel[] = {{&roln_stiefel, 2, 6, 0}};
    uint64_t seed = 3;
    int pass;
    for (pass = 0; pass < 10; pass++) {
        problem p = {0};
        roln_lbfgs state = ROLN_LBFGS_START;
        roln_real x[12], l[6], Q[36], G[4];
        roln_status st;
        p.n = 6, p.k = 2;
        symmetric(6, &seed, p.A);
        CHECK(roln_stiefel_init(2, 6, x, &seed, room_of(ROLN_STIEFEL_INIT_WORK(2))) == ROLN_OK);
        CHECK(roln_eig(6, p.A, l, Q, room_of(ROLN_EIG_WORK(6))) == ROLN_OK);
        st = minimise(stiefel, 1, subspace, &p, 200, ROLN_STIEFEL_BLOCK_WORK(2, 6), &state, x);
        CHECK(st == ROLN_E_NO_CONVERGENCE || st == ROLN_OK);
        CHECK_NEAR(state.value, -(l[4] + l[5]), 64 * ROLN_EPS);
        roln_mm_bt(2, 6, 2, x, x, G);
        CHECK_NEAR(G[0], 1, 8 * ROLN_EPS), CHECK_NEAR(G[3], 1, 8 * ROLN_EPS), CHECK_NEAR(G[1], 0, 8 * ROLN_EPS);
    }
}

/* What a step leaves: the newest pair is the step and the change of the gradient, H y = s, H scales what is normal to both by
   s.y / y.y; on a manifold all pairs are tangents where it ends. */
static void test_pairs(void)
{
    static const roln_block flat[] = {{ROLN_EUCLIDEAN, 1, 6, 0}}, sphere[] = {{&roln_stiefel, 1, 6, 0}};
    problem p = {0};
    roln_lbfgs state = ROLN_LBFGS_START;
    roln_real x[6] = {0}, x0[6], g0[6], keep[ROLN_LBFGS_KEEP(M, 6)], d[6], a[M], *pair = keep + 6;
    uint64_t seed = 5;
    int t, i, k, count = 0;
    p.n = 6, p.k = 1;
    for (t = 0; t < 40; t++) {
        const roln_real *s, *y;
        const int newest = state.newest;
        rolni_copy(6, x, x0), rolni_copy(6, keep, g0);
        CHECK(roln_lbfgs_step(1, flat, M, valley, &p, &state, x, keep, room_of(ROLN_LBFGS_WORK(M, 6, 0))) == ROLN_OK);
        CHECK_BELOW(room_used(), room_end);
        if (state.newest == newest) continue; /* the curvature was negative */
        count++;
        s = pair + 12 * state.newest, y = s + 6;
        for (i = 0; i < 6 && t > 0; i++) {
            CHECK_NEAR(s[i], x[i] - x0[i], 4 * ROLN_EPS);
            CHECK(y[i] == keep[i] - g0[i]);
        }
        rolni_lbfgs_direction(M, 6, &state, y, pair, a, d);
        for (i = 0; i < 6; i++)
            CHECK_NEAR(d[i], -s[i], 256 * ROLN_EPS);
        if (state.pairs > 1) continue;
        for (i = 0; i < 6; i++) /* of one pair */
            g0[i] = roln_normal(&seed);
        for (k = 0; k < 4000; k++) { /* made normal to both, one after the other */
            const roln_real *v = k % 2 ? s : y, f = roln_dot(6, g0, v) / roln_dot(6, v, v);
            for (i = 0; i < 6; i++)
                g0[i] -= f * v[i];
        }
        rolni_lbfgs_direction(M, 6, &state, g0, pair, a, d);
        for (i = 0; i < 6; i++)
            CHECK_NEAR(d[i] / (roln_dot(6, s, y) / roln_dot(6, y, y)), -g0[i], 1e-3);
    }
    CHECK(count > 10);
    symmetric(6, &seed, p.A);
    state = (roln_lbfgs)ROLN_LBFGS_START;
    CHECK(roln_stiefel_init(1, 6, x, &seed, room_of(ROLN_STIEFEL_INIT_WORK(1))) == ROLN_OK);
    for (t = 0; t < 8; t++) {
        const int verb = ROLN_STIEFEL_BLOCK_WORK(1, 6);
        CHECK(roln_lbfgs_step(1, sphere, M, subspace, &p, &state, x, keep, room_of(ROLN_LBFGS_WORK(M, 6, verb))) == ROLN_OK);
        for (k = 0; k < 2 * state.pairs; k++) {
            const roln_real *v = pair + 6 * ((state.newest + M - k / 2) % M * 2 + k % 2);
            CHECK_NEAR(roln_dot(6, x, v), 0, 16 * ROLN_EPS * ROLN_MAX(1, ROLN_SQRT(roln_dot(6, v, v))));
        }
    }
}

/* All manifolds side by side: the gradient where it ends is normal to them. */
static void test_nearest(void)
{
    static const roln_block table[] = {{&roln_biorthogonal, 2, 5, 0}, {ROLN_EUCLIDEAN, 1, 3, 0}, {&roln_spd, 3, 3, 0},
                                       {&roln_stiefel, 2, 4, 0}};
    enum { P = 20 + 3 + 9 + 8, AT_SPD = 23, AT_STIEFEL = 32 };
    const int verb = ROLN_MAX(ROLN_BIORTH_BLOCK_WORK(2, 5), ROLN_MAX(ROLN_SPD_BLOCK_WORK(3), ROLN_STIEFEL_BLOCK_WORK(2, 4)));
    uint64_t seed = 11;
    int pass;
    for (pass = 0; pass < 5; pass++) {
        problem p = {0};
        roln_lbfgs state = ROLN_LBFGS_START;
        roln_real x[P] = {0}, g[2 * P] = {0}, W[4];
        roln_status st;
        int i;
        p.n = P;
        for (i = 0; i < P; i++)
            p.A[i] = roln_normal(&seed) / 2;
        for (i = 0; i < 3; i++) { /* an SPD matrix of its own can be reached */
            x[AT_SPD + 4 * i] = 2;
            p.A[AT_SPD + 4 * i] = 3;
        }
        for (i = 0; i < 2; i++)
            x[6 * i] = x[10 + 6 * i] = 1, x[AT_STIEFEL + 5 * i] = 1;
        st = minimise(table, 4, nearest, &p, 300, verb, &state, x);
        CHECK(st == ROLN_E_NO_CONVERGENCE || st == ROLN_OK);
        nearest(&p, x, g);
        CHECK(rolni_tangents(4, table, x, 1, P, g, room_of(verb)) == ROLN_OK);
        CHECK_BELOW(roln_dot(P, g, g), 1000 * ROLN_EPS * state.value);
        roln_mm_bt(2, 5, 2, x + 10, x, W);
        CHECK_NEAR(W[0], 1, 64 * ROLN_EPS), CHECK_NEAR(W[3], 1, 64 * ROLN_EPS);
        CHECK_NEAR(W[1], 0, 64 * ROLN_EPS), CHECK_NEAR(W[2], 0, 64 * ROLN_EPS);
    }
}

/* <A, x>, which nothing bounds from below, leads a block as far as it goes; with -A it leaves that place. */
static roln_real slope(void *ctx, const roln_real *x, roln_real *g)
{
    const problem *p = ctx;
    int i;
    for (i = 0; i < p->n; i++)
        g[i] += p->A[i];
    return roln_dot(p->n, p->A, x);
}

static void test_back(void)
{
    static const roln_block table[] = {{&roln_biorthogonal, 2, 5, 0}, {&roln_biorthogonal, 3, 3, 0}, {&roln_spd, 3, 3, 0}};
    enum { P = 20 + 18 + 9, AT_PAIR = 20, AT_SPD = 38 };
    const int verb = ROLN_MAX(ROLN_BIORTH_BLOCK_WORK(3, 5), ROLN_SPD_BLOCK_WORK(3));
    uint64_t seed = 12;
    int pass, b;
    for (pass = 0; pass < 10; pass++)
        for (b = 0; b < 4; b++) { /* each, and all */
            static const int from[4] = {0, AT_PAIR, AT_SPD, 0}, size[4] = {20, 18, 9, P};
            const int n = size[b];
            problem p = {0};
            roln_lbfgs state = ROLN_LBFGS_START;
            roln_real start[P] = {0}, *x = start + from[b], turn[P], W[9];
            roln_status st;
            int i;
            for (i = 0; i < 3; i++) {
                if (i < 2) start[6 * i] = start[10 + 6 * i] = 1;
                start[AT_PAIR + 4 * i] = start[AT_PAIR + 9 + 4 * i] = start[AT_SPD + 4 * i] = 1;
            }
            for (p.n = n, i = 0; i < n; i++)
                p.A[i] = roln_normal(&seed);
            st = minimise(table + b % 3, b < 3 ? 1 : 3, slope, &p, 3000, verb, &state, x);
            CHECK(st == ROLN_E_NO_CONVERGENCE || st == ROLN_OK);
            memcpy(turn, x, (size_t)n * sizeof *x);
            for (i = 0; i < n; i++)
                p.A[i] *= -1;
            state = (roln_lbfgs)ROLN_LBFGS_START;
            st = minimise(table + b % 3, b < 3 ? 1 : 3, slope, &p, 1, verb, &state, x);
            CHECK(st == ROLN_OK);
            CHECK(memcmp(turn, x, (size_t)n * sizeof *x) != 0);
            if (b > 1) continue;
            roln_mm_bt(2 + b, 5 - 2 * b, 2 + b, x + n / 2, x, W);
            for (i = 0; i < (2 + b) * (2 + b); i++)
                CHECK_NEAR(W[i], i % (3 + b) == 0, 84 * ROLN_EPS);
        }
}

/* Whatever fails leaves x as it was, and a value that fails at the ends of long steps only makes them shorter. */
static roln_real wall(void *ctx, const roln_real *x, roln_real *g)
{
    problem *p = ctx;
    p->calls++;
    g[0] += -1 / x[0] + 4; /* 4 x - log x */
    return x[0] > 0 ? 4 * x[0] - roln_log(x[0]) : not_a_number();
}

/* A metric of its own. */
static roln_real measure(int rows, int cols, const roln_real *x, const roln_real *u, const roln_real *v)
{
    (void)x;
    return 2 * roln_dot(rows * cols, u, v);
}

static void test_refused(void)
{
    static const roln_block flat[] = {{ROLN_EUCLIDEAN, 1, 4, 0}}, one[] = {{ROLN_EUCLIDEAN, 1, 1, 0}};
    static roln_manifold own;
    roln_block measured[] = {{NULL, 1, 3, 0}};
    roln_real x[4] = {0, 0, 0, 0}, x0[4], keep[ROLN_LBFGS_KEEP(M, 4)];
    int from, gradient;
    for (gradient = 0; gradient < 2; gradient++)
        for (from = 1; from < 8; from++) {
            problem p = {0};
            roln_lbfgs state = ROLN_LBFGS_START;
            roln_status st = ROLN_OK;
            int t;
            p.n = 4, p.bad_from = from, p.bad_gradient = gradient;
            memset(x, 0, sizeof x);
            for (t = 0; t < 8 && st == ROLN_OK; t++) {
                memcpy(x0, x, sizeof x);
                st = roln_lbfgs_step(1, flat, M, valley, &p, &state, x, keep, room_of(ROLN_LBFGS_WORK(M, 4, 0)));
            }
            CHECK(st == ROLN_E_NOT_FINITE && memcmp(x, x0, sizeof x) == 0);
            CHECK(p.calls <= from + TRIES_MOST);
        }
    {
        problem p = {0};
        roln_lbfgs state = ROLN_LBFGS_START;
        roln_real y[1] = {8};
        roln_status st = ROLN_OK;
        int t;
        state.first = 100; /* far beyond the wall */
        for (t = 0; t < 50 && st == ROLN_OK; t++)
            st = roln_lbfgs_step(1, one, M, wall, &p, &state, y, keep, room_of(ROLN_LBFGS_WORK(M, 1, 0)));
        CHECK_NEAR(y[0], 0.25, 8 * sqrt((double)ROLN_EPS));
    }
    own = roln_stiefel;
    own.inner = measure;
    measured[0].manifold = &own;
    {
        problem p = {0};
        roln_lbfgs state = ROLN_LBFGS_START;
        p.n = 3;
        x[0] = 1, x[1] = x[2] = 0;
        CHECK(roln_lbfgs_step(1, measured, M, nearest, &p, &state, x, keep, room_of(ROLN_LBFGS_WORK(M, 3, 64))) == ROLN_E_SHAPE);
        CHECK(x[0] == 1 && x[1] == 0 && x[2] == 0);
    }
}

void TEST_NAME(lbfgs)(void);
void TEST_NAME(lbfgs)(void)
{
    test_valley();
    test_bowl();
    test_subspace();
    test_pairs();
    test_nearest();
    test_back();
    test_refused();
}
