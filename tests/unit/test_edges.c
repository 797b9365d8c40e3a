/* SPDX-License-Identifier: MIT */
/* test_edges.c - what only overflow, a matrix on the edge, a verb of somebody's own, or a setting that no machine has, reach: the
   status of each, and outputs that stay as they were. The other files test what functions are for; this one completes the
   branches and conditions of tests/safety/coverage.py. */

#define CALLED(X) X(push) X(slopes)
#define ROLN_NAME units /* every joint has a unit of its own */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_SCALE each
#define ROLN_HORIZON 2
#define ROLN_PLAN 4, 2
#include "called.h"

#define ROLN_NAME slider /* one joint as it is */
#define ROLN_AE 1
#define ROLN_MLP 2
#include "roln.h"

#undef CALLED
#define CALLED(X) \
    X(allocate) X(push) X(tick) X(guard_tick) X(lqr) X(grad) X(grad_acc) X(rows) X(fit_limits) X(fit_noise) X(filter_tick) X(errors)
#define CALLED_ALSO "edges_inside.h"
#define SMALL_ROWS 2
#define SMALL_LEARN everything
#include "small.h"

void TEST_NAME(edges)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* The largest number. */
#ifdef ROLN_DOUBLE
#define TOP 1.7976931348623157e308
#define LEAST 4.9406564584124654e-324
#else
#define TOP 3.40282347e38f
#define LEAST 1.40129846e-45f
#endif

static roln_real theta[MAXP];

/* ---- kernels ---------------------------------------------------------------------------------- */

/* An eigenvalue beyond the largest number, at either end. */
static void test_eigenvalues(void)
{
    roln_real A[4], l[2], Q[4], work[ROLN_EIG_WORK(2)];
    fill(4, TOP, A);
    CHECK(roln_eig(2, A, l, Q, work) == ROLN_E_NOT_FINITE);
    fill(4, -TOP, A);
    CHECK(roln_eig(2, A, l, Q, work) == ROLN_E_NOT_FINITE);
    fill(4, -TOP / 4, A);
    CHECK(roln_eig(2, A, l, Q, work) == ROLN_OK && l[0] < -ROLN_C(0.49) * TOP);
}

/* Fewer rows than columns: R^T R = X^T X, zeros below the diagonal. */
static void test_wide_triangle(void)
{
    enum { ROWS = 2, COLS = 4 };
    roln_real X[ROWS * COLS], R[ROWS * COLS], work[ROLN_QR_R_WORK(ROWS, COLS)];
    uint64_t s = 1;
    int i, j, k;
    dyadic(ROWS * COLS, 1, &s, X);
    memcpy(R, X, sizeof R);
    roln_qr_r(ROWS, COLS, R, work);
    for (i = 0; i < COLS; i++)
        for (j = 0; j < COLS; j++) {
            ld a = 0;
            for (k = 0; k < ROWS; k++)
                a += (ld)R[k * COLS + i] * (ld)R[k * COLS + j] - (ld)X[k * COLS + i] * (ld)X[k * COLS + j];
            CHECK_NEAR(a, 0, 16 * (double)ROLN_EPS);
        }
    CHECK(all(1, R + COLS, 0));
}

/* X + X^T, and not a number more: what a network has behind it is scratch. */
static void test_twice_sym(void)
{
    const roln_real X[6] = {1, 2, 3, 4, 5, 6};
    roln_real Y[5] = {7, 7, 7, 7, 7};
    rolni_twice_sym(2, X, Y);
    CHECK(all(1, Y, 2) && all(2, Y + 1, 5) && all(1, Y + 3, 8) && all(1, Y + 4, 7));
}

/* Weights so large that a factor overflows where the feedback does not. */
static void test_riccati(void)
{
    const roln_real A[4] = {ROLN_C(0.125), 0, 0, ROLN_C(0.125)}, B[2] = {0, 1}, r[1] = {1};
    roln_real D[4], C[4], K[2], work[ROLN_DARE_WORK(2, 1)];
    fill(4, TOP, D), fill(4, 7, C), fill(2, 7, K);
    CHECK(roln_riccati(2, 1, A, B, D, r, C, K, work) == ROLN_E_NOT_FINITE && all(4, C, 7) && all(2, K, 7));
    fill(4, 0, D), D[0] = D[3] = 2 * ROLN_SQRT(TOP);
    CHECK(roln_dare(2, 1, A, B, D, r, C, K, work) == ROLN_E_NO_CONVERGENCE && all(4, C, 7) && all(2, K, 7));
}

/* The logarithm of what is so small that exp does not come back from it. */
static void test_least_logarithm(void)
{
    const roln_real l[1] = {LEAST};
    roln_real f[1], K[1];
    CHECK(rolni_dd1(ROLN_LOG, 1, l, f, K) != ROLN_OK);
}

/* Any weights, limits and dynamics, over the whole range of exponents: a plan that is taken is finite and within its limits, one
   that is refused says so. */
static void test_ocp(void)
{
    enum { n = 2, m = 1, STEPS = 3, TRIES = 4000, PARTS = 7 };
    static const int size[PARTS] = {STEPS * n * n, STEPS * n * m, STEPS * n * n, STEPS * n, m, m, STEPS * m};
    static roln_real work[4000], part[PARTS][STEPS * n * n];
    roln_real u[STEPS * m], x[(STEPS + 1) * n], K[STEPS * m * n], gap;
    uint64_t s = 2;
    int t, i, p, j, taken = 0, refused = 0;
    for (t = 0; t < TRIES; t++) {
        roln_ocp of;
        roln_status st;
        memset(&of, 0, sizeof of);
        for (p = 0; p < PARTS; p++) {
            const roln_real by = roln_exp(roln_normal(&s) * (t % 4 == 0 ? 1 : t % 4 == 1 ? ROLN_C(20.0) : roln_log(TOP) / 2));
            for (i = 0; i < size[p]; i++)
                part[p][i] = by * roln_normal(&s);
        }
        for (i = 0; i < STEPS; i++) /* symmetric, and mostly positive */
            for (j = 0; j < n * n; j++)
                part[2][i * n * n + j] = j % (n + 1) == 0 ? ROLN_ABS(part[2][i * n * n]) : part[2][i * n * n] / 4;
        part[4][0] = ROLN_ABS(part[4][0]), part[5][0] = 0;
        for (i = 0; i < STEPS * m; i++)
            part[6][i] = roln_uniform(&s) - ROLN_C(0.5);
        of.n = n, of.m = m, of.steps = STEPS, of.A = part[0], of.B = part[1], of.Q = part[2], of.q = part[3], of.r = part[4];
        of.ref = part[5], of.at = part[6];
        st = roln_ocp_solve(&of, 6, u, x, K, t % 2 ? &gap : NULL, work);
        taken += st == ROLN_OK, refused += st == ROLN_E_NOT_FINITE;
        if (st != ROLN_OK) continue;
        CHECK(roln_all_finite(STEPS * m, u) && roln_all_finite((STEPS + 1) * n, x) && roln_all_finite(STEPS * m * n, K));
        for (i = 0; i < STEPS * m; i++)
            CHECK(ROLN_ABS(u[i]) <= 1);
    }
    CHECK(taken > 100 && refused > 20);
}

/* A A^T of more columns than a group holds, and more terms than a block: twice, turned and not, the same bits, and the diagonal
   right. */
static void test_large_sums(void)
{
    enum { n = 300, k = 280 };
    static roln_real A[k * n], At[n * k], S[n * (n + 1) + 1], T[n * (n + 1) + 1], work[ROLN_SYM_WORK];
    uint64_t s = 9;
    int i, j, equal = 1;
    dyadic(k * n, 1, &s, A);
    for (i = 0; i < k; i++)
        for (j = 0; j < n; j++)
            At[j * k + i] = A[i * n + j];
    roln_sym_at(k, n, 0, n, A, S, work);
    roln_sym_bt(n, k, 0, n, At, T, work);
    CHECK(memcmp(S, T, sizeof S) == 0);
    for (i = 0; i < n; i++) {
        ld sum = 0;
        for (j = 0; j < k; j++)
            sum += (ld)A[j * n + i] * (ld)A[j * n + i];
        equal &= fabsl(sum - (ld)S[i * (n + 1) + i]) <= 1e-5L * sum;
    }
    CHECK(equal);
}

/* ---- manifolds -------------------------------------------------------------------------------- */

/* Verbs that fail, or lead to infinity, at one of their calls. */
static int calls_left;
static int verb_size(int rows, int cols) { return rows * cols; }
static int verb_work(int rows, int cols) { return 0 * rows * cols; }
static roln_status verb_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm, roln_real *work)
{
    (void)rows, (void)cols, (void)x, (void)count, (void)stride, (void)gm, (void)work;
    return calls_left-- == 0 ? ROLN_E_ILL_CONDITIONED : ROLN_OK;
}
static roln_status verb_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    int i;
    (void)work;
    if (calls_left-- == 0) return ROLN_E_ILL_CONDITIONED;
    for (i = 0; i < rows * cols; i++)
        xn[i] = x[i] + u[i];
    return ROLN_OK;
}
static roln_status verb_far(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    (void)rows, (void)cols, (void)x, (void)u, (void)work;
    xn[0] = (roln_real)INFINITY;
    return ROLN_OK;
}

/* A bowl in two dimensions; a value whose gradient is 0, or so large that its square is not a number. */
static roln_real slope_at;
static roln_real bowl(void *ctx, const roln_real *x, roln_real *g)
{
    (void)ctx;
    g[0] = slope_at * x[0], g[1] = slope_at * 3 * x[1];
    return slope_at * (x[0] * x[0] + 3 * x[1] * x[1]) / 2;
}

static void test_lbfgs(void)
{
    enum { M = 3, P = 2 };
    static const roln_manifold own = {verb_size, verb_work, verb_tangent, NULL, verb_retract};
    const roln_block table[] = {{&own, 1, P, 0}}, flat[] = {{ROLN_EUCLIDEAN, 1, P, 0}};
    roln_real keep[ROLN_LBFGS_KEEP(M, P)], work[ROLN_LBFGS_WORK(M, P, 8)], x[P], before[P];
    int from, failed = 0, t;
    slope_at = 1;
    for (from = 0; from < 40; from++) { /* verb after verb fails: x stays, and it goes on */
        roln_lbfgs state = ROLN_LBFGS_START;
        calls_left = from;
        x[0] = 1, x[1] = ROLN_C(0.5);
        for (t = 0; t < 6; t++) {
            roln_status st;
            memcpy(before, x, sizeof x);
            st = roln_lbfgs_step(1, table, M, bowl, NULL, &state, x, keep, work);
            if (st == ROLN_OK) continue;
            failed += st == ROLN_E_ILL_CONDITIONED;
            CHECK(memcmp(before, x, sizeof x) == 0 && st == ROLN_E_ILL_CONDITIONED && state.pairs == 0);
        }
        CHECK_BELOW(ROLN_ABS(x[0]), 1);
    }
    CHECK(failed > 10);
    calls_left = -1;
    for (t = 0; t < 2; t++) { /* nowhere to go; and steeper than a number can say */
        roln_lbfgs state = ROLN_LBFGS_START;
        const roln_status want = t == 0 ? ROLN_E_NO_CONVERGENCE : ROLN_E_NOT_FINITE;
        slope_at = t == 0 ? 0 : 2 * ROLN_SQRT(TOP);
        x[0] = x[1] = 1;
        CHECK(roln_lbfgs_step(1, flat, M, bowl, NULL, &state, x, keep, work) == want && all(P, x, 1));
    }
}

/* Adam does not follow a verb to infinity. */
static void test_far(void)
{
    static const roln_manifold far = {verb_size, verb_work, verb_tangent, NULL, verb_far};
    const roln_block table[] = {{&far, 1, 2, 0}};
    const roln_opt opt = ROLN_OPT(ROLN_C(0.1), ROLN_C(0.1));
    roln_real x[2] = {1, 1}, m[2] = {0, 0}, v = 0, w = 0, work[64];
    const roln_real g[2] = {1, 1};
    const roln_moments moments = {m, &v, &w};
    roln_adam a = {0, 0, 0};
    calls_left = -1;
    CHECK(roln_adam_update(1, table, &opt, 1, g, x, &a, &moments, work) == ROLN_E_NOT_FINITE && all(2, x, 1));
}

/* A base point that is not positive definite; one beyond the edge, which may come back but not go on; and any step from there. */
static void test_spd_block(void)
{
    const roln_real thin = 4 * ROLN_EPS;
    roln_real x[4] = {1, 2, 2, 1}, u[4] = {0, 0, 0, 0}, xn[4], work[ROLN_SPD_BLOCK_WORK(2)];
    uint64_t s = 3;
    int t;
    fill(4, 7, xn);
    CHECK(roln_spd.retract(2, 2, x, u, xn, work) == ROLN_E_NOT_SPD && all(4, xn, 7));
    x[0] = 1, x[1] = x[2] = 0, x[3] = thin;
    u[3] = thin / 2;
    CHECK(roln_spd.retract(2, 2, x, u, xn, work) == ROLN_OK && xn[3] > x[3]);
    u[3] = -thin / 2;
    CHECK(roln_spd.retract(2, 2, x, u, xn, work) == ROLN_E_RANGE);
    for (t = 0; t < 200; t++) { /* whatever it is, the point is left or stays as it was, symmetric and positive */
        const roln_real a = roln_exp(roln_normal(&s) * 4), b = a * (1 - ROLN_EPS * (roln_real)(1 + roln_randint(64, &s)));
        roln_status st;
        x[0] = x[3] = a, x[1] = x[2] = b;
        u[0] = roln_normal(&s) * a, u[1] = u[2] = roln_normal(&s) * a, u[3] = roln_normal(&s) * a;
        st = roln_spd.retract(2, 2, x, u, xn, work);
        if (st == ROLN_OK) CHECK(xn[0] > 0 && xn[3] > 0 && xn[1] <= xn[2] && xn[1] >= xn[2]);
    }
}

/* ---- a model ---------------------------------------------------------------------------------- */

typedef roln_status (*cost_joints)(const instance *m, const roln_cost *cost, const roln_real *z, roln_real *D, void *work);
#define COST_JOINTS(name) name##_c_cost_joints
static const cost_joints cost_of_joints[MODELS] = SMALL_TABLE(COST_JOINTS, COST_JOINTS);

static roln_real z_min[MAXN], z_max[MAXN], zd_max[MAXN];
static instance model_of(int k)
{
    const instance m = {models[k], scale_of(k), z_min, z_max, zd_max, theta, NULL};
    return m;
}

static void place(int k)
{
    uint64_t s = 400 + (uint64_t)k;
    parameters(k, &s, theta);
    fill(MAXN, -1, z_min), fill(MAXN, 1, z_max), fill(MAXN, 2, zd_max);
}

/* Numbers that overflow on the way: refused, outputs untouched. */
static void test_overflow(int k)
{
    const instance m = model_of(k);
    const int N = N_OF(k), n = n_OF(k);
    static roln_real D[4 * MAXN * MAXN], A[4 * MAXN * MAXN];
    roln_real z[MAXN], zd[MAXN], B[MAXN * 2], u[2] = {7, 7}, l[2 * MAXN], lost = 7;
    const roln_real q[MAXN] = {1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1};
    const roln_motors motors = {.count = 2, .B = B, .mu = ROLN_C(1e-3)};
    const roln_cost cost = {q, q, q, dt, NULL};
    uint64_t s = 500 + (uint64_t)k;
    roln_status st;
    place(k);
    fill(n, TOP, z), fill(n, 0, zd), dyadic(2 * N, 1, &s, B);
    CHECK(cost_of_joints[k](&m, &cost, z, D, spare) != ROLN_OK || models[k]->md->ae.layers == 0);
    fill(n, 0, z), fill(n, TOP, zd);
    if (models[k]->md->inputs == 0) {
        st = m.of->allocate(&m, z, &motors, zd, u, &lost, spare);
        if (st != ROLN_OK) CHECK(all(2, u, 7) && all(1, &lost, 7));
    }
    fill(4 * n * n, (roln_real)NAN, A);
    CHECK(rolni_lqr_end(2 * n, A, D, l, spare) != ROLN_OK);
    fill(4 * n * n, 0, A), A[0] = 4;
    CHECK(rolni_lqr_end(2 * n, A, D, l, spare) == ROLN_OK);
    fill(n, -TOP, z_min), fill(n, TOP, z_max);
    {
        roln_real kept[MAXP];
        memcpy(kept, theta, sizeof kept);
        if (models[k]->md->ae.monomials > 0) {
            int i, at = rolni_bent_at(&models[k]->md->ae), bent = roln_ae_bent(&models[k]->md->ae);
            for (i = 0; i < n * bent; i++)
                kept[at + i] = theta[at + i] = 2;
            CHECK(roln_chart_center(&models[k]->md->ae, z_min, z_max, theta) == ROLN_E_NOT_FINITE);
            CHECK(memcmp(kept, theta, sizeof kept) == 0);
        }
    }
}

/* A decoder that is no left inverse; a fit or features beyond the largest number: refused, theta and the sums untouched. */
static void test_chart(void)
{
    const roln_ae *ae = &chart_model.ae;
    const roln_status refused = sizeof(roln_real) == 4 ? ROLN_E_NOT_FINITE : ROLN_E_ILL_CONDITIONED; /* sums are double */
    enum { N = chart_N, n = chart_n, m = 1 + chart_n + chart_monomials };
    static double sums[m * (m + 1) / 2 + m * chart_N + 1], doubles[4000], C[2] = {0, 0}, E[1];
    roln_real q[N], before[MAXP], left = 7;
    const roln_real none[1] = {0};
    double *const h = sums + m * (m + 1) / 2;
    int i, at = rolni_bent_at(ae);
    CHECK(rolni_chart_polish(1, 2, 1, none, none, C, E) == ROLN_E_ILL_CONDITIONED);
    place(CHART);
    fill(2 * n * N + N, 0, theta + at);
    for (i = 0; i < n; i++)
        theta[at + n * N + i * N + i] = 1; /* Psi^T */
    for (i = 0; i < m; i++)
        sums[i * (i + 3) / 2] = i <= n ? 1 : 1e-20;
    for (i = 0; i < n; i++)
        h[(1 + i) * N + i] = 1;
    h[(1 + n) * N + N - 1] = (double)TOP / 4;
    memcpy(before, theta, sizeof before);
    CHECK(roln_chart_solve(ae, sums, 0, theta, &left, doubles) == refused && all(1, &left, 7));
    CHECK(memcmp(before, theta, sizeof before) == 0);
    fill(N, TOP / 2, q), fill(n * N, 2, theta + at + n * N);
    memset(sums, 0, sizeof sums);
    CHECK(roln_chart_add(ae, theta, 1, q, 1, NULL, sums, doubles, spare) == ROLN_E_NOT_FINITE && sums[0] <= 0);
}

/* A load acts on a step without any torque, as the same torque by way of J^T would where that is known: none at all is no load. */
static void test_load(int k)
{
    const instance m = model_of(k);
    const int n = n_OF(k);
    roln_real load[MAXN], a[2 * MAXN], b[2 * MAXN], c[2 * MAXN];
    uint64_t s = 600 + (uint64_t)k;
    place(k);
    dyadic(2 * n, ROLN_C(0.125), &s, a);
    memcpy(b, a, sizeof b), memcpy(c, a, sizeof c);
    fill(n, 0, load);
    CHECK(m.of->push(&m, a, a + n, NULL, load, dt, spare) == m.of->push(&m, b, b + n, NULL, NULL, dt, spare));
    CHECK_BELOW(furthest(2 * n, a, b), 0);
    fill(n, 1, load);
    if (m.of->push(&m, c, c + n, NULL, load, dt, spare) == ROLN_OK) CHECK(furthest(2 * n, c, b) > 1e-6L);
}

/* A torque limit below 0, motors that no machine has: a fault, and no torque but 0 or what was held. */
static void test_guard(int k)
{
    const instance m = model_of(k);
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    roln_real q[MAXN], qd[MAXN], z[MAXN], zd[MAXN], r[5 * MAXN], tau[MAXN], safe[MAXN], B[MAXN];
    const roln_motors wrong = {.B = models[k]->md->inputs > 0 ? B : NULL};
    const target_at ref = {r, r + n, r + 2 * n, r + 3 * n, r + 4 * n, NULL};
    roln_guard g;
    const guard_at held = {&g, tau};
    roln_limits l;
    uint64_t s = 700 + (uint64_t)k;
    uint32_t f;
    int i;
    place(k);
    memset(&g, 0, sizeof g), memset(&l, 0, sizeof l);
    dyadic(N, ROLN_C(0.0625), &s, q), dyadic(N, ROLN_C(0.0625), &s, qd), dyadic(5 * n, ROLN_C(0.0625), &s, r);
    fill(MAXN, 1, safe), fill(MAXN, 0, tau), fill(MAXN, 0, B);
    l.dt = dt, l.tau = 1000, l.hold = 2, l.margin = 100;
    f = m.of->tick(&m, &l, q, qd, &ref, z, zd, &held, spare); /* without limits->motors, with inputs too */
    CHECK((f & ~(uint32_t)ROLN_FAULT_RANGE) == 0 || (f & ROLN_FAULT_STATUS));
    CHECK(roln_all_finite(F, tau));
    l.motors = &wrong;
    f = m.of->tick(&m, &l, q, qd, &ref, z, zd, &held, spare);
    CHECK((f & (ROLN_FAULT_STATUS | ROLN_FAULT_INPUT)) == (ROLN_FAULT_STATUS | ROLN_FAULT_INPUT));
    l.motors = NULL, l.tau = -1, l.safe = safe, l.hold = 0;
    for (i = 0; i < 2; i++) {
        f = m.of->tick(&m, &l, q, qd, &ref, z, zd, &held, spare);
        CHECK((f & ROLN_FAULT_INPUT) && all(F, tau, 0));
    }
    l.tau = 1, l.hold = 2, l.strict = 1; /* where the measurement or what is wanted is no number, nothing is said of its limits */
    fill(n, 0, z), fill(n, 0, zd), fill(MAXN, 2, tau), memset(&g, 0, sizeof g);
    q[0] = (roln_real)NAN;
    CHECK(m.of->guard_tick(&m, &l, q, qd, z, zd, tau, &held, spare) == ROLN_FAULT_INPUT);
    q[0] = 0, safe[F - 1] = (roln_real)NAN, fill(F - 1, 2, safe);
    CHECK(m.of->guard_tick(&m, &l, q, qd, z, zd, safe, &held, spare) == ROLN_FAULT_OUTPUT);
}

/* The torque of motors that are the joints or inputs themselves is what it is. */
static void test_motors(void)
{
    const roln_real B[4] = {1, 2, 3, 4}, u[2] = {5, 6};
    const roln_motors own = {.count = 0}, two = {.count = 2, .B = B};
    roln_real tau[2];
    CHECK(rolni_motors_tau(2, NULL, u, tau) == u && rolni_motors_tau(2, &own, u, tau) == u);
    CHECK(rolni_motors_tau(2, &two, NULL, tau) == NULL);
    CHECK(rolni_motors_tau(2, &two, u, tau) == tau && tau[0] == 17 && tau[1] == 39);
}

/* Feedback without what is left of the cost is the same feedback; friction is no damping to it, at rest and on the move. */
static void test_feedback(int k)
{
    const instance m = model_of(k);
    const int n = n_OF(k), F = F_OF(k);
    static roln_real K[MAXN * 2 * MAXN], K1[MAXN * 2 * MAXN], P[4 * MAXN * MAXN], weight[MAXN];
    const roln_motors own = {.count = 0};
    const roln_cost cost = {weight, weight, weight, dt, NULL}, by_own = {weight, weight, weight, dt, &own};
    roln_real s[2 * MAXN];
    int sign;
    place(k);
    fill(MAXN, 1, weight);
    for (sign = -1; sign < 2; sign++) {
        fill(2 * n, 0, s), s[n] = ROLN_C(0.0625) * (roln_real)sign;
        if (m.of->lqr(&m, &cost, s, NULL, K, P, spare) != ROLN_OK) continue;
        CHECK_OK(m.of->lqr(&m, &cost, s, NULL, K1, NULL, spare));
        CHECK(memcmp(K, K1, (size_t)(F * 2 * n) * sizeof *K) == 0);
        if (models[k]->md->inputs == 0) continue;
        CHECK_OK(m.of->lqr(&m, &by_own, s, NULL, K1, NULL, spare)); /* the learned motors by name */
        CHECK(memcmp(K, K1, (size_t)(F * 2 * n) * sizeof *K) == 0);
    }
}

/* A cost to go that overflows where its factor is just finite. Nearly all of the cost is that of the position, since a step is so
   short; its weight goes up with that of the motor, until roln_dare refuses the sum of squares of the factor. Below this edge the
   last digit of the factor, which the steps behind the doubling change, is enough: P is refused, the feedback without P is not. */
static void test_cost_to_go(void)
{
    enum { TRIES = 20, BELOW = 100 };
    static slider_params p;
    static slider_start start;
    static slider_lqr_work work;
    const slider_latent s = {{0}, {0}};
    const roln_real none[1] = {0};
    roln_real q[1], u[1], K[2], P[4];
    const roln_cost cost = {q, none, u, sizeof(roln_real) == 4 ? ROLN_C(1e-5) : ROLN_C(1e-10), NULL};
    uint64_t seed = 1, r = 2;
    int t, i, refused = 0;
    CHECK_OK(slider_init(&p, &seed, &start.init));
    p.dt = ROLN_C(0.01), p.z_min[0] = -1, p.z_max[0] = 1, p.zd_max[0] = 1;
    for (t = 0; t < TRIES; t++) {
        roln_real low = 1, high = TOP;
        q[0] = TOP / 2 * (1 + roln_uniform(&r));
        for (i = 0; i < 400; i++) {
            u[0] = low / 2 + high / 2;
            if (slider_lqr(&p, &cost, &s, NULL, K, NULL, &work) == ROLN_OK) low = u[0];
            else high = u[0];
        }
        for (i = 0; i < BELOW; i++) {
            u[0] = low * (1 - (roln_real)i * ROLN_EPS / 2);
            if (slider_lqr(&p, &cost, &s, NULL, K, NULL, &work) != ROLN_OK) continue;
            fill(2, 7, K), fill(4, 7, P);
            if (slider_lqr(&p, &cost, &s, NULL, K, P, &work) == ROLN_OK) CHECK(roln_all_finite(4, P) && roln_all_finite(2, K));
            else CHECK(all(4, P, 7) && all(2, K, 7)), refused++;
        }
    }
    CHECK(refused > 0);
}

/* Motors, or torques, on a mass so small that the input matrix of a plan overflows, or only what it makes of the torques. */
static void test_plan_overflow(void)
{
    enum { STEPS = units_steps, MOTORS = units_motors, n2 = 2 * units_n };
    static units_params p;
    static union {
        units_init_work init;
        units_plan_linear_work plan_linear;
    } work;
    static units_plan plan;
    static roln_real at[units_N * MOTORS], A[STEPS * n2 * n2], B[STEPS * n2 * MOTORS], c[STEPS * n2];
    const roln_motors motors = {.count = MOTORS, .B = at};
    const roln_limits l = {.motors = &motors};
    const roln_goal goal = {.limits = &l, .dt = dt};
    uint64_t seed = 4;
    CHECK_OK(units_init(&p, &seed, &work.init));
    p.scale.m = ROLN_C(1e-6), memset(&plan, 0, sizeof plan), plan.plan.valid = 1;
    fill(units_N * MOTORS, 1, at);
    CHECK_OK(units_plan_linear(&p, &goal, &plan, A, B, c, &work.plan_linear));
    plan.u[0] = TOP, plan.u[1] = -TOP; /* together nothing */
    CHECK(units_plan_linear(&p, &goal, &plan, A, B, c, &work.plan_linear) == ROLN_E_NOT_FINITE);
    CHECK(roln_all_finite(n2 * MOTORS, B));
    fill(MOTORS, 0, plan.u), fill(units_N * MOTORS, TOP / 8, at);
    CHECK(units_plan_linear(&p, &goal, &plan, A, B, c, &work.plan_linear) == ROLN_E_NOT_FINITE);
    CHECK(!roln_all_finite(n2 * MOTORS, B));
}

/* Recordings that lack what they need, each kind of need by itself. */
static void test_batches(int k)
{
    const instance m = model_of(k);
    const roln_motors own = {.count = 0};
    static roln_real q[8 * MAXN], tau_each[MAXN], rate_each[MAXN], each[MAXN];
    roln_batch b = {.count = 2, .steps = 3, .stride = 1, .q = q};
    static roln_real g[GRADIENT_SIZE(MAXP)], J[2 * MAXP], r[2];
    roln_limits l, was;
    roln_loss w;
    int i;
    place(k);
    memset(&w, 0, sizeof w), memset(&l, 0, sizeof l);
    for (i = 0; i < 8 * MAXN; i++)
        q[i] = ROLN_C(0.001) * (roln_real)(i % 7);
    b.steps = 0, b.qd = q;
    CHECK(m.of->grad_acc(&m, &w, &b, g, spare) == ROLN_E_LENGTH); /* no qdd */
    b.qd = NULL, b.qdd = q;
    CHECK(m.of->grad_acc(&m, &w, &b, g, spare) == ROLN_E_LENGTH); /* no qd */
    CHECK(m.of->rows(&m, &w, &b, dt, 1, J, r, spare) == ROLN_E_LENGTH);
    b.qdd = NULL, b.steps = 1, w.q = 1;
    {
        CHECK(m.of->rows(&m, &w, &b, dt, 1, J, r, spare) != ROLN_E_LENGTH);
        q[0] = (roln_real)NAN; /* the first of two ends it */
        CHECK(m.of->grad(&m, &w, &b, dt, g, spare) == ROLN_E_NOT_FINITE);
        b.steps = 0, b.qd = b.qdd = q;
        CHECK(m.of->grad_acc(&m, &w, &b, g, spare) == ROLN_E_NOT_FINITE);
        b.steps = 1, b.qd = b.qdd = NULL, q[0] = 0;
    }
    for (i = 0; i < 2; i++) { /* a prediction from positions needs two steps */
        w.z = i == 0 ? 1 : 0, w.q_pred = i == 1 ? 1 : 0;
        CHECK(m.of->grad(&m, &w, &b, dt, g, spare) == ROLN_E_LENGTH);
        CHECK(m.of->rows(&m, &w, &b, dt, 1, J, r, spare) == ROLN_E_LENGTH);
    }
    l.dt = dt, l.motors = &own, l.residual_window = 0, b.qd = q;
    b.tau = q, was = l; /* torques of the model's own motors */
    if (m.of->fit_limits(&m, &b, 2, &l, tau_each, rate_each, spare) == ROLN_OK) CHECK(l.tau_each == tau_each && l.dt >= was.dt);
    l = was, b.tau = NULL, l.motors = NULL, l.tau_each = each, fill(MAXN, 1, each); /* limits that are yours */
    if (m.of->fit_limits(&m, &b, 2, &l, tau_each, rate_each, spare) == ROLN_OK) CHECK(l.tau_each == each);
    l.tau_each = NULL, l.tau = 0;
    CHECK(m.of->fit_limits(&m, &b, 2, &l, tau_each, rate_each, spare) == ROLN_E_RANGE);
}

/* Noise from recordings of which a second window cannot start, of torques that no model follows, of ticks without a measurement. */
static void test_noise(int k)
{
    enum { TICKS = 8 };
    const instance m = model_of(k);
    const int N = N_OF(k), F = F_OF(k);
    static roln_real q[2 * TICKS * MAXN], tau[2 * TICKS * MAXN], each[MAXN];
    const roln_batch b = {.count = 2, .steps = TICKS - 1, .stride = 1, .q = q, .tau = tau};
    roln_noise l, was;
    uint64_t s = 800 + (uint64_t)k;
    int what;
    place(k);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta, &s, spare));
    for (what = 0; what < 5; what++) {
        roln_status st;
        dyadic(2 * TICKS * N, ROLN_C(0.001), &s, q), dyadic(2 * TICKS * F, ROLN_C(0.125), &s, tau), fill(MAXN, 7, each);
        memset(&l, 0, sizeof l);
        l.dt = dt, l.q = what == 1 ? 0 : ROLN_C(0.001);
        if (what == 1) l.q_each = q + N; /* known, joint by joint */
        if (what == 2) q[TICKS * N] = (roln_real)NAN;
        if (what == 3) fill(F, TOP, tau + TICKS / 2 * F);
        if (what == 4) fill(N, (roln_real)NAN, q + 3 * N);
        if (what == 1) fill(N, ROLN_C(0.001), q + N);
        was = l;
        st = m.of->fit_noise(&m, &b, &l, what == 0 ? NULL : each, NULL, spare);
        if (what == 2) CHECK(st != ROLN_OK);
        if (st != ROLN_OK) CHECK(memcmp(&l, &was, sizeof l) == 0);
        else CHECK(l.tau > 0 && roln_finite(l.tau) && l.q_each == was.q_each);
        CHECK(all(MAXN, each, 7));
    }
}

/* The decoder writes no number behind those that it gives. */
static void test_behind(void)
{
    enum { n = units_n, N = units_N };
    static units_params p;
    static union {
        units_init_work init;
        units_decode_work decode;
    } work;
    struct {
        roln_real x[2 * N], behind[N];
    } to;
    roln_real z[n], zd[n];
    uint64_t seed = 6;
    int i;
    CHECK_OK(units_init(&p, &seed, &work.init));
    p.scale.q = 2;
    for (i = 0; i < N; i++)
        p.each[i] = 3;
    dyadic(n, ROLN_C(0.25), &seed, z), dyadic(n, ROLN_C(0.25), &seed, zd), fill(N, 7, to.behind);
    CHECK_OK(units_i_decode(&p, z, zd, to.x, work.decode.tape, work.decode.s));
    CHECK(all(N, to.behind, 7) && roln_all_finite(2 * N, to.x));
}

/* What a plan shall cost, of joints with units of their own and of coordinates by rows C: its gradient against differences. What a
   load does to a step, the same. Long: one model and one set of arrays for both. */
static void test_own_units(void)
{
    enum { n = units_n, N = units_N, n2 = 2 * n, TERMS = 4, ROWS = 2 };
    static const roln_real each[N] = {2, ROLN_C(0.5), 1, 4, ROLN_C(0.25)};
    static units_params p;
    static union {
        units_init_work init;
        units_i_goal_work goal;
    } work;
    const roln_scale sc = {2, ROLN_C(0.5), 1};
    const instance m = {&units_called, &sc, z_min, z_max, zd_max, p.theta, each};
    roln_real C[ROWS * N], weight[N], ref[N], s[n2], Q[4 * n * n], q[n2], load[n], A[n2 * n2], L[n2 * n], A1[n2 * n2];
    roln_term term[TERMS];
    roln_goal goal;
    const slopes_at to = {A, NULL, L}, slope = {A1, NULL, NULL};
    const double h = sizeof(roln_real) == 4 ? 1.0 / 64 : 1.0 / 4096, bound = sizeof(roln_real) == 4 ? 2e-2 : 1e-5;
    uint64_t seed = 4;
    int i, j;
    CHECK_OK(units_init(&p, &seed, &work.init));
    fill(MAXN, -1, z_min), fill(MAXN, 1, z_max), fill(MAXN, 2, zd_max);
    dyadic(ROWS * N, 1, &seed, C), dyadic(N, ROLN_C(0.125), &seed, ref), fill(N, 1, weight), dyadic(n2, ROLN_C(0.25), &seed, s);
    memset(term, 0, sizeof term), memset(&goal, 0, sizeof goal);
    for (i = 0; i < TERMS; i++) {
        term[i].of = i, term[i].weight = weight, term[i].ref = ref;
        if (i == ROLN_OF_Z || i == ROLN_OF_ZD) term[i].C = C, term[i].count = ROWS;
    }
    goal.terms = TERMS, goal.term = term;
    p.scale = sc, memcpy(p.each, each, sizeof p.each);
    {
        roln_real cost = 0;
        CHECK_OK(units_i_goal_at(&p, &goal, 0, s, &cost, Q, q, &work.goal));
    }
    dyadic(n, ROLN_C(0.25), &seed, load);
    for (i = 0; i < n2; i++) {
        roln_real side[2] = {0, 0}, t[n2];
        for (j = 0; j < 2; j++) {
            memcpy(t, s, sizeof t), t[i] += (roln_real)(j ? h : -h);
            CHECK_OK(units_i_goal_at(&p, &goal, 0, t, side + j, NULL, NULL, &work.goal));
        }
        CHECK_NEAR(((double)side[1] - (double)side[0]) / (2 * h), (double)q[i], bound * (1 + (double)largest(n2, q)));
    }
    {
        roln_real t[n2];
        memcpy(t, s, sizeof t);
        CHECK_OK(m.of->slopes(&m, t, t + n, NULL, load, dt, &to, spare));
        memcpy(t, s, sizeof t);
        CHECK_OK(m.of->slopes(&m, t, t + n, NULL, load, dt, &slope, spare)); /* of the load no derivative */
        CHECK(memcmp(A, A1, sizeof A) == 0);
        memcpy(t, s, sizeof t);
        CHECK_OK(m.of->slopes(&m, t, t + n, NULL, NULL, dt, &slope, spare)); /* no force at all */
        CHECK(memcmp(A, A1, sizeof A) != 0);
    }
    for (i = 0; i < n; i++) {
        roln_real side[2][n2];
        const roln_real was = load[i];
        for (j = 0; j < 2; j++) {
            memcpy(side[j], s, sizeof side[j]);
            load[i] = was + (roln_real)(j ? h : -h);
            CHECK_OK(m.of->push(&m, side[j], side[j] + n, NULL, load, dt, spare));
        }
        load[i] = was;
        for (j = 0; j < n2; j++)
            CHECK_NEAR(((double)side[1][j] - (double)side[0][j]) / (2 * h), (double)L[j * n + i], bound);
    }
}

/* The filter's estimate is finite whatever it is told, over the whole range of exponents. */
static void test_filter(int k)
{
    enum { TRIES = 300 };
    const instance m = model_of(k);
    const int N = N_OF(k), n = n_OF(k), side = (2 + models[k]->load) * n;
    roln_real y[MAXN], z[MAXN], zd[MAXN], F[9 * MAXN * MAXN], load[MAXN] = {0};
    uint64_t s = 900 + (uint64_t)k;
    int t, i, lost = 0;
    place(k);
    for (t = 0; t < TRIES; t++) {
        const roln_real wide = roln_log(TOP) / (roln_real)(1 + t % 4);
        roln_filter filter;
        const filter_at e = {&filter, z, zd, F, load, NULL};
        roln_noise noise;
        uint32_t f;
        memset(&filter, 0, sizeof filter), memset(&noise, 0, sizeof noise);
        filter.valid = t % 5 != 0;
        noise.dt = dt, noise.q = roln_exp(roln_normal(&s) * wide / 4), noise.tau = roln_exp(roln_normal(&s) * wide / 4);
        fill(n, 0, load);
        noise.gate = t % 2 ? 0 : 5, noise.lost = 1;
        for (i = 0; i < N; i++)
            y[i] = t % 3 && i == t % N ? (roln_real)NAN : roln_normal(&s) * roln_exp(roln_normal(&s) * wide / 3);
        for (i = 0; i < n; i++)
            z[i] = roln_normal(&s), zd[i] = roln_normal(&s);
        for (i = 0; i < side * side; i++) {
            const roln_real r = roln_exp(roln_normal(&s) * wide / 2);
            F[i] = i % (side + 1) ? 0 : ROLN_MIN(r, TOP / 4);
        }
        f = m.of->filter_tick(&m, &noise, y, NULL, &e, spare);
        lost += (f & ROLN_FAULT_STATUS) != 0;
        CHECK(roln_all_finite(n, z) && roln_all_finite(n, zd) && roln_all_finite(side * side, F));
    }
    CHECK(lost < TRIES);
}

/* A weight of what is left at the end: none at all, and one that is no weight. */
static void test_weights(void)
{
    roln_real P[4] = {0, 0, 0, 0}, L[4], q[10], each[5];
    int i;
    CHECK_OK(rolni_goal_weighs(2, P, L));
    P[1] = P[2] = 1;
    CHECK(rolni_goal_weighs(2, P, L) == ROLN_E_NOT_SPD);
    for (i = 0; i < 10; i++)
        q[i] = i < 5 ? TOP : -TOP;
    rolni_fit_each(&units_model, 2, q, each); /* beyond the largest number, or just within */
    CHECK(roln_all_finite(5, each));
}

/* The error of a prediction that overflows, in each of what is told of it. */
static void test_errors(void)
{
    enum { TICKS = 4 };
    const instance m = model_of(PLAIN);
    static roln_real q[TICKS * MAXN], qd[TICKS * MAXN], qbar[MAXN];
    const roln_batch b = {.count = 1, .steps = TICKS - 1, .stride = 1, .q = q, .qd = qd};
    roln_error e[TICKS];
    int what;
    place(PLAIN);
    for (what = 0; what < 4; what++) {
        roln_status st;
        fill(TICKS * MAXN, 0, q), fill(TICKS * MAXN, 0, qd), fill(MAXN, 0, qbar);
        if (what == 1) fill(1, TOP, q + 2 * N_OF(PLAIN));
        if (what == 2) fill(1, TOP, qbar);
        if (what == 3) fill(1, TOP, qd + 2 * N_OF(PLAIN));
        st = m.of->errors(&m, &b, dt, 1, qbar, &(roln_errors){e, NULL, NULL}, spare);
        CHECK(st == (what == 0 ? ROLN_OK : ROLN_E_NOT_FINITE));
    }
    { /* errors of the joints alone overflow, whose unit is large */
        static units_params p;
        static union {
            units_init_work init;
            units_errors_work errors;
        } work;
        const roln_real each[units_N] = {PICK(1e18f, 1e153), 1, 1, 1, 1};
        roln_error joints[TICKS * units_N];
        uint64_t seed = 7;
        CHECK_OK(units_init(&p, &seed, &work.init));
        memcpy(p.each, each, sizeof p.each);
        for (what = 0; what < 2; what++) {
            fill(TICKS * MAXN, 0, q), fill(TICKS * MAXN, 0, qd), fill(MAXN, 0, qbar);
            q[0] = q[units_N] = q[2 * units_N] = 100 * each[0];
            CHECK(units_errors(&p, &b, dt, 1, qbar, &(roln_errors){e, what ? joints : NULL, NULL}, &work.errors) ==
                  (what ? ROLN_E_NOT_FINITE : ROLN_OK));
        }
    }
}

/* Where weights are written for flash: another least, a unit of angles. */
static int puts_seen;
static void put_nothing(void *ctx, const char *text) { (void)ctx, (void)text, puts_seen++; }
static void test_write(void)
{
    static wheel_params p;
    static wheel_start start;
    uint64_t seed = 2;
    int what;
    puts_seen = 0;
    for (what = 0; what < 3; what++) {
        CHECK_OK(wheel_init(&p, &seed, &start.init));
        if (what == 0) p.eigenvalue_floor *= 2;
        if (what == 1) p.slope /= 2;
        if (what == 2) p.scale.q = 2;
        CHECK(roln_write(&wheel_model, "w", &p, put_nothing, NULL) == ROLN_E_SHAPE && puts_seen == 0);
    }
    CHECK_OK(wheel_init(&p, &seed, &start.init)); /* as it is */
    CHECK(roln_write(&wheel_model, "w", &p, put_nothing, NULL) == ROLN_OK && puts_seen > 0);
    CHECK(wheel_init_pod(&p, 0, p.theta, p.theta, p.theta, &seed, &start.init_pod) != ROLN_OK);
}

/* Of one model: a plan's torque between ticks, learned friction. */
static void test_plans(void)
{
    static wheel_params p;
    static wheel_start start;
    static union {
        wheel_plan_next_work plan_next;
        wheel_plan_linear_work plan_linear;
    } work;
    static wheel_plan plan;
    roln_real c[wheel_n], v[wheel_n], u[wheel_motors], tau[wheel_motors], weight[wheel_n], zero[wheel_n];
    static const roln_real B[wheel_N * wheel_motors] = {1, 0, 0, 0, 0, 1};
    const roln_motors motors = {.count = wheel_motors, .B = B};
    roln_limits limits;
    roln_goal goal;
    roln_term term;
    wheel_latent s;
    uint64_t seed = 1;
    CHECK_OK(wheel_init(&p, &seed, &start.init));
    CHECK_OK(wheel_friction_of(&p, c, v));
    CHECK(roln_all_finite(wheel_n, c) && roln_all_finite(wheel_n, v) && v[0] > 0);
    fill(wheel_n, -3, p.z_min), fill(wheel_n, 3, p.z_max), fill(wheel_n, 100, p.zd_max);
    memset(&limits, 0, sizeof limits), memset(&goal, 0, sizeof goal), memset(&s, 0, sizeof s), memset(&plan, 0, sizeof plan);
    fill(wheel_motors, 1, tau), fill(wheel_n, 1, weight), fill(wheel_n, 0, zero), fill(wheel_motors, 7, u);
    limits.dt = goal.dt = dt, limits.tau_each = tau, limits.margin = 1, limits.motors = &motors;
    goal.limits = &limits, goal.u = weight;
    CHECK(wheel_plan_follow(&p, &goal, &plan, 0, &s, u) == ROLN_E_LENGTH && all(wheel_motors, u, 7));
    p.slope *= 2; /* another config's */
    CHECK(wheel_plan_follow(&p, &goal, &plan, 0, &s, u) == ROLN_E_SHAPE && all(wheel_motors, u, 7));
    p.slope /= 2;
    memset(&term, 0, sizeof term);
    term.of = ROLN_OF_ZD, term.count = 1, term.C = weight, term.weight = weight, term.ref = zero;
    goal.terms = 1, goal.term = &term; /* a sum of velocities */
    CHECK_OK(wheel_plan_next(&p, &goal, &s, &plan, &work.plan_next));
    CHECK_OK(wheel_plan_follow(&p, &goal, &plan, dt / 2, &s, u));
    CHECK(roln_all_finite(wheel_motors, u) && largest(wheel_motors, u) <= 1);
    {
        enum { n2 = 2 * wheel_n };
        static roln_real A[4 * n2 * n2], Bk[4 * n2 * wheel_motors], ck[4 * n2];
        const roln_motors three = {.count = 3, .B = B}, negative = {.count = wheel_motors, .B = B, .mu = -1};
        CHECK_OK(wheel_plan_linear(&p, &goal, &plan, A, Bk, ck, &work.plan_linear));
        limits.motors = &three;
        CHECK(wheel_plan_linear(&p, &goal, &plan, A, Bk, ck, &work.plan_linear) == ROLN_E_LENGTH);
        limits.motors = &negative;
        CHECK(wheel_plan_linear(&p, &goal, &plan, A, Bk, ck, &work.plan_linear) == ROLN_E_LENGTH);
        limits.motors = &motors;
        plan.s[0].zd[0] = TOP;
        CHECK(wheel_plan_linear(&p, &goal, &plan, A, Bk, ck, &work.plan_linear) != ROLN_OK);
        plan.plan.valid = 0;
        CHECK(wheel_plan_linear(&p, &goal, &plan, A, Bk, ck, &work.plan_linear) == ROLN_E_LENGTH);
    }
    p.scale.q = 2;
    CHECK(wheel_friction_of(&p, c, v) == ROLN_E_SHAPE);
    plan.plan.valid = 1, plan.plan.age = 0;
    for (int i = 1; i <= wheel_steps; i++) { /* the plan grows old, and ends */
        CHECK(wheel_plan_next(&p, &goal, &s, &plan, &work.plan_next) == ROLN_E_SHAPE);
        CHECK(plan.plan.age == i % wheel_steps && plan.plan.valid == (i < wheel_steps));
    }
}

void TEST_NAME(edges)(void)
{
    int k;
    test_eigenvalues();
    test_wide_triangle();
    test_twice_sym();
    test_riccati();
    test_least_logarithm();
    test_ocp();
    test_lbfgs();
    test_far();
    test_spd_block();
    test_large_sums();
    test_motors();
    for (k = 0; k < MODELS; k++) {
        test_overflow(k);
        test_load(k);
        test_guard(k);
        test_feedback(k);
        test_batches(k);
        test_filter(k);
        if (!models[k]->md->lnn.angles && k != PUSHED && k != DEEP) test_noise(k);
    }
    test_cost_to_go();
    test_plan_overflow();
    test_behind();
    test_own_units();
    test_weights();
    test_errors();
    test_chart();
    test_write();
    test_plans();
}
