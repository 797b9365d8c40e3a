/* SPDX-License-Identifier: MIT */
/* Joints with units of their own (ROLN_SCALE each): where these are powers of two, every function gives the bits that it gives for
   joints that were scaled by hand; where they are not, the gradient passes a slope test. How they are fitted, kept and refused, and
   that metres or millimetres make no difference to a training. */
#define ROLN_NAME wheels /* as wheel */
#define ROLN_AE 3
#define ROLN_MLP 4, 5
#define ROLN_ANGLES 1, 0, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_HORIZON 3
#define ROLN_SCALE each
#include "roln.h"

#define ROLN_NAME charts /* as chart */
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 3
#define ROLN_HORIZON 3
#define ROLN_BLOCK 4
#define ROLN_SCALE each
#include "roln.h"

#define ROLN_NAME rail /* a slider and a hinge */
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_HORIZON 4
#define ROLN_SCALE each
#include "roln.h"

#define ROLN_NAME alike /* the same with one unit */
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_HORIZON 4
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME geared
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SCALE each
#include "roln.h"

#define ROLN_NAME geared8
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_SCALE each
#define ROLN_STORE int8
#include "roln.h"
#endif

#include "small.h"

void TEST_NAME(units)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* ---- two models that are one ------------------------------------------------------------------ */

/* Model k and the same with own units: of a state x of the first, x_j each_j is the same state of the second, of a force tau on it
   tau_j / each_j, unless a learned input map comes before. */
typedef struct {
    int k, N, n, F;
    roln_model md;
    instance plain, own;
    roln_real each[MAXN], theta[MAXP], low[MAXN], high[MAXN];
} pair;

static void pair_of(int k, uint64_t *s, pair *p)
{
    static const roln_real power[10] = {4,  ROLN_C(0.125), 2, ROLN_C(0.0625),  8, ROLN_C(0.5),
                                       16, ROLN_C(0.25), 32, ROLN_C(0.03125)};
    int i;
    p->k = k, p->N = N_OF(k), p->n = n_OF(k), p->F = F_OF(k);
    parameters(k, s, p->theta);
    for (i = 0; i < p->N; i++)
        p->each[i] = models[k]->md->lnn.angles >> i & 1 ? 1 : power[i];
    fill(MAXN, -100, p->low), fill(MAXN, 100, p->high);
    p->md = *models[k]->md, p->md.own = 1;
    p->plain = trained(models[k], scale_of(k), p->theta);
    p->plain.z_min = p->low, p->plain.z_max = p->plain.zd_max = p->high;
    p->own = p->plain, p->own.model = &p->md, p->own.each = p->each;
}

/* y_ij = x_ij each_j^power of the rows x [rows][N]. */
static void in_units(const pair *p, int power, int rows, const roln_real *x, roln_real *y)
{
    int i, j;
    for (i = 0; i < rows * p->N; i++) {
        roln_real by = 1;
        for (j = 0; j < (power < 0 ? -power : power); j++)
            by *= p->each[i % p->N];
        y[i] = power < 0 ? x[i] / by : x[i] * by;
    }
}

/* Forces x [rows][F] of the plain model for the other. */
static void force_in_units(const pair *p, int rows, const roln_real *x, roln_real *y)
{
    if (p->md.inputs > 0) memcpy(y, x, (size_t)(rows * p->F) * sizeof *y);
    else in_units(p, -1, rows, x, y);
}

static int reduce_work(int k, int own)
{
    sizes z = models[k]->size;
    z.own = own;
    return ROLN_REDUCE_WORK(OF_Z);
}

/* ---- prediction and control ------------------------------------------------------------------- */

static void test_states(int k)
{
    static pair p;
    const int which[2] = {N_OF(k) - 1, 0}, some = ROLN_MIN(2, N_OF(k));
    roln_real x[3 * MAXN], X[3 * MAXN], z[2][3 * MAXN], y[2][2 * MAXN], at[MAXN];
    uint64_t s = 10 + (uint64_t)k;
    int i, N;
    pair_of(k, &s, &p), N = p.N;
    dyadic(3 * N, 1, &s, x), in_units(&p, 1, 3, x, X);
    for (i = 1; i < 4; i++) {
        roln_real *zdd[2] = {i > 1 ? z[0] + 2 * p.n : NULL, i > 1 ? z[1] + 2 * p.n : NULL};
        fill(3 * MAXN, 7, z[0]), fill(3 * MAXN, 7, z[1]);
        CHECK_OK(p.plain.of->aim(&p.plain, x, x + N, i > 2 ? x + 2 * N : NULL, z[0], z[0] + p.n, zdd[0], ROOM(aim)));
        CHECK_OK(p.own.of->aim(&p.own, X, X + N, i > 2 ? X + 2 * N : NULL, z[1], z[1] + p.n, zdd[1], ROOM(aim)));
        CHECK(same(3 * MAXN, z[0], z[1]));
    }
    CHECK_OK(p.plain.of->decode(&p.plain, z[0], z[0] + p.n, y[0], y[0] + N, ROOM(decode)));
    CHECK_OK(p.own.of->decode(&p.own, z[0], z[0] + p.n, y[1], y[1] + N, ROOM(decode)));
    in_units(&p, 1, 2, y[0], y[0]);
    CHECK(same(2 * N, y[0], y[1]));
    CHECK_OK(roln_decode_some(&p.own, z[0], z[0] + p.n, some, which, X, X + some, ROOM(decode_some)));
    for (i = 0; i < some; i++)
        CHECK(same(1, X + i, y[1] + which[i]) && same(1, X + some + i, y[1] + N + which[i]));
    CHECK_OK(p.plain.of->lift(&p.plain, z[0], z[0] + p.n, y[0], ROOM(lift)));
    CHECK_OK(p.own.of->lift(&p.own, z[0], z[0] + p.n, y[1], ROOM(lift)));
    in_units(&p, -1, 1, y[0], y[0]);
    CHECK(same(N, y[0], y[1]));
    in_units(&p, 1, 1, x + N, at);
    CHECK_OK(p.plain.of->inertia(&p.plain, z[0], x + N, y[0], ROOM(inertia)));
    CHECK_OK(p.own.of->inertia(&p.own, z[0], at, y[1], ROOM(inertia)));
    in_units(&p, -1, 1, y[0], y[0]);
    CHECK(same(N, y[0], y[1]));
    in_units(&p, -2, 2, x, X);
    CHECK_OK(p.plain.of->gains(&p.plain, z[0], x, x + N, y[0], y[0] + p.n, ROOM(gains)));
    CHECK_OK(p.own.of->gains(&p.own, z[0], X, X + N, y[1], y[1] + p.n, ROOM(gains)));
    CHECK(same(2 * p.n, y[0], y[1]));
}

/* Motors, count at the joints, B [N][count]: of the model with own units B_j / each_j. */
static void check_motors(const pair *p, const roln_real *z, uint64_t *s)
{
    roln_real B[2][3 * MAXN], u[2][MAXN] = {{0}}, missed[2] = {0, 0};
    const int k = p->k, count = p->md.inputs > 0 ? 0 : ROLN_MIN(3, p->N);
    const roln_motors plain = {.count = count, .B = count > 0 ? B[0] : NULL, .mu = ROLN_C(0.5)}, own = {.count = count, .B = count > 0 ? B[1] : NULL, .mu = ROLN_C(0.5)};
    int i;
    dyadic(3 * MAXN, 1, s, B[0]);
    for (i = 0; i < p->N * count; i++)
        B[1][i] = B[0][i] / p->each[i / count];
    CHECK_OK(p->plain.of->allocate(&p->plain, z, &plain, z + p->n, u[0], missed, ROOM(allocate)));
    CHECK_OK(p->own.of->allocate(&p->own, z, &own, z + p->n, u[1], missed + 1, ROOM(allocate)));
    CHECK(same(count > 0 ? count : p->md.inputs, u[0], u[1]) && same(1, missed, missed + 1) && missed[0] > 0);
}

static void test_forces(int k)
{
    static pair p;
    static roln_real A[2][256], B[2][512];
    roln_real z[2][2 * MAXN], tau[2][MAXN], y[2][MAXN], s0[2 * MAXN];
    uint64_t s = 20 + (uint64_t)k;
    int i, j, n, F;
    pair_of(k, &s, &p), n = p.n, F = p.F;
    dyadic(2 * n, ROLN_C(0.5), &s, s0), dyadic(F, 1, &s, tau[0]), force_in_units(&p, 1, tau[0], tau[1]);
    CHECK_OK(p.plain.of->reduce(&p.plain, s0, tau[0], y[0], room_of(reduce_work(k, 0))));
    ROOM_KEPT();
    CHECK_OK(p.own.of->reduce(&p.own, s0, tau[1], y[1], room_of(reduce_work(k, 1))));
    CHECK_ROOM();
    CHECK(same(n, y[0], y[1]));
    for (i = 0; i < 2; i++) { /* without a force, with one */
        for (j = 0; j < 2; j++) {
            const instance *m = j ? &p.own : &p.plain;
            memcpy(z[j], s0, sizeof s0);
            CHECK_OK(m->of->step(m, z[j], z[j] + n, i ? tau[j] : NULL, dt / 8, ROOM(step)));
            CHECK_OK(m->of->linear(m, z[j], z[j] + n, i ? tau[j] : NULL, dt / 8, A[j], B[j], ROOM(linear)));
            ROOM_KEPT();
        }
        CHECK(same(2 * n, z[0], z[1]) && same(4 * n * n, A[0], A[1]));
        for (j = 0; j < 2 * n * F; j++)
            B[0][j] *= p.md.inputs > 0 ? 1 : p.each[j % F];
        CHECK(same(2 * n * F, B[0], B[1]) && largest(2 * n * F, B[0]) > 0);
    }
    fill(MAXN, 7, y[0]), y[1][0] = (roln_real)NAN; /* of a force that is not finite */
    memcpy(y[1] + 1, tau[1] + 1, (size_t)(F - 1) * sizeof *tau[1]);
    CHECK(p.own.of->reduce(&p.own, s0, y[1], y[0], spare) == ROLN_E_NOT_FINITE && all(MAXN, y[0], 7));
    check_motors(&p, s0, &s);
}

/* Feedback of motors at every joint, or of learned inputs: weights q_j / each_j^2, u_j each_j^2. */
static void test_feedback(int k)
{
    static pair p;
    static roln_real K[2][2 * MAXN * MAXN], w[2][3 * MAXN], P[2][256];
    roln_real s0[2 * MAXN] = {0};
    uint64_t s = 30 + (uint64_t)k;
    int i, F;
    pair_of(k, &s, &p), F = p.F;
    dyadic(p.n, ROLN_C(0.5), &s, s0);
    for (i = 0; i < 3 * MAXN; i++)
        w[0][i] = 1 + ROLN_C(0.125) * (roln_real)(i % 3);
    for (i = 0; i < F && k == DEEP; i++)
        w[0][2 * p.N + i] = ROLN_C(1e6);
    in_units(&p, -2, 2, w[0], w[1]);
    if (p.md.inputs > 0) memcpy(w[1] + 2 * p.N, w[0] + 2 * p.N, (size_t)F * sizeof *w[0]);
    else in_units(&p, 2, 1, w[0] + 2 * p.N, w[1] + 2 * p.N);
    for (i = 0; i < 2; i++) {
        const roln_cost cost = {w[i], w[i] + p.N, w[i] + 2 * p.N, dt, NULL};
        CHECK_OK(i ? &p.own : &p.plain->of->lqr(i ? &p.own : &p.plain, &cost, s0, NULL, K[i], P[i], ROOM(lqr)));
    }
    for (i = 0; i < 2 * p.n * F; i++)
        K[0][i] /= p.md.inputs > 0 ? 1 : p.each[i / (2 * p.n)];
    CHECK(same(2 * p.n * F, K[0], K[1]) && same(4 * p.n * p.n, P[0], P[1]));
}

/* Ticks of a filter: a torque that nobody knows is tau / each_j on the joints of the second. */
static void test_estimates(int k)
{
    static pair p;
    static roln_real F[2][4 * MAXN * MAXN];
    roln_real y[2][MAXN], tau[2][MAXN], q_each[2][MAXN], z[2][2 * MAXN];
    roln_filter f[2];
    uint32_t faults[2];
    uint64_t s = 60 + (uint64_t)k;
    int i, t;
    pair_of(k, &s, &p);
    memset(f, 0, sizeof f);
    fill(MAXN, ROLN_C(0.125), q_each[0]), in_units(&p, 1, 1, q_each[0], q_each[1]);
    dyadic(p.N, ROLN_C(0.25), &s, y[0]);
    for (t = 0; t < 4; t++) {
        y[0][0] += ROLN_C(0.0625);
        dyadic(p.F, ROLN_C(0.25), &s, tau[0]);
        in_units(&p, 1, 1, y[0], y[1]), force_in_units(&p, 1, tau[0], tau[1]);
        for (i = 0; i < 2; i++) {
            const roln_noise noise = {dt, 0, ROLN_C(0.5), 0, 0, q_each[i], NULL, 0};
            const filter_at to = {&f[i], z[i], z[i] + p.n, F[i], NULL};
            faults[i] = i ? &p.own : &p.plain->of->filter_tick(i ? &p.own : &p.plain, &noise, y[i], tau[i], &to, ROOM(filter_tick));
        }
        CHECK(faults[0] == faults[1] && f[0].known && same(1, &f[0].nis, &f[1].nis) && (t > 0 || (faults[0] & ROLN_FILTER_START)));
        CHECK(same(2 * p.n, z[0], z[1]) && same(4 * p.n * p.n, F[0], F[1]));
    }
}

/* Ticks of a controller, and what the guard sees in them: the energy balance is the same, torques are each in its unit. */
static void test_ticks(int k)
{
    enum { TICKS = 4 };
    static pair p;
    static roln_real q[2][2 * TICKS * MAXN], all_tau[2][TICKS * MAXN];
    roln_real ref[5 * MAXN], tau[2][MAXN] = {{0}}, z[2][2 * MAXN], most[2][2 * MAXN];
    roln_guard g[2] = {{.known = 0}, {.known = 0}};
    roln_limits fit[2] = {{.dt = dt}, {.dt = dt}};
    const roln_limits limits = {.dt = dt, .margin = 1, .power = 1000, .tau = ROLN_C(1e6), .hold = 1};
    uint64_t s = 40 + (uint64_t)k;
    int N, i, j;
    pair_of(k, &s, &p), N = p.N;
    dyadic(5 * MAXN, ROLN_C(0.25), &s, ref), dyadic(2 * TICKS * N, ROLN_C(0.25), &s, q[0]), in_units(&p, 1, 2 * TICKS, q[0], q[1]);
    for (i = 0; i < TICKS; i++) {
        uint32_t faults[2];
        for (j = 0; j < 2; j++) {
            const instance *m = j ? &p.own : &p.plain;
            const target_at target = {ref, ref + p.n, ref + 2 * p.n, ref + 3 * p.n, ref + 4 * p.n, NULL};
            const roln_measured full = {q[j] + 2 * i * N, q[j] + (2 * i + 1) * N};
            const guard_at held = {&g[j], tau[j]};
            const roln_motors damped = {.mu = 1};
            roln_limits l = limits;
            if (p.md.inputs > 0) l.motors = &damped;
            faults[j] = m->of->tick(m, &l, &full, &target, z[j], z[j] + p.n, &held, ROOM(tick));
        }
        CHECK(faults[0] == faults[1] && same(2 * p.n, z[0], z[1]) && g[0].known && g[1].known);
        CHECK(same(1, &g[0].residual, &g[1].residual) && same(1, &g[0].power, &g[1].power) && (i == 0 || g[1].residual != 0));
        force_in_units(&p, 1, tau[0], ref + 4 * MAXN);
        CHECK(same(p.F, ref + 4 * MAXN, tau[1]) && largest(p.F, tau[1]) > 0);
        memcpy(all_tau[0] + i * p.F, tau[0], sizeof tau[0]), memcpy(all_tau[1] + i * p.F, tau[1], sizeof tau[1]);
    }
    for (j = 0; j < 2; j++) {
        static roln_real x[2][TICKS * MAXN];
        const roln_batch b = {1, TICKS - 1, 1, NULL, x[0], x[1], NULL, all_tau[j]};
        for (i = 0; i < 2 * TICKS; i++)
            memcpy(x[i % 2] + i / 2 * N, q[j] + i * N, (size_t)N * sizeof *x[0]);
        CHECK_OK(j ? &p.own : &p.plain->of->fit_limits(j ? &p.own : &p.plain, &b, 2, &fit[j], most[j], most[j] + p.F, ROOM(fit_limits)));
    }
    force_in_units(&p, 2, most[0], most[0]);
    CHECK(same(2 * p.F, most[0], most[1]) && same(1, &fit[0].margin, &fit[1].margin) && same(1, &fit[0].power, &fit[1].power));
}

/* ---- training --------------------------------------------------------------------------------- */

enum { NUMBERS = 900, COUNT = 4, ODE = 0, ACC, POSITIONS, KINDS };
typedef struct {
    roln_real q[NUMBERS], qd[NUMBERS], qdd[NUMBERS], tau[NUMBERS];
    roln_batch b;
} recording;

/* Windows of two steps of two samples; of single samples for accelerations. */
static void record(const pair *p, int kind, uint64_t *s, recording *r)
{
    const int samples = COUNT * 5;
    int i;
    CHECK(samples * p->N <= NUMBERS);
    dyadic(samples * p->N, ROLN_C(0.25), s, r->q), dyadic(samples * p->N, ROLN_C(0.25), s, r->qd);
    dyadic(samples * p->N, 1, s, r->qdd), dyadic(samples * p->F, ROLN_C(0.25), s, r->tau);
    for (i = p->N; i < samples * p->N && kind == POSITIONS; i++)
        r->q[i] = r->q[i % p->N] + r->q[i] / 64;
    memset(&r->b, 0, sizeof r->b);
    r->b.count = COUNT, r->b.steps = kind == ACC ? 0 : 2, r->b.stride = 2;
    r->b.q = r->q, r->b.qd = kind == POSITIONS ? NULL : r->qd, r->b.qdd = kind == ACC ? r->qdd : NULL, r->b.tau = r->tau;
}

static void record_in_units(const pair *p, const recording *r, recording *to)
{
    const int samples = COUNT * 5;
    in_units(p, 1, samples, r->q, to->q), in_units(p, 1, samples, r->qd, to->qd), in_units(p, 1, samples, r->qdd, to->qdd);
    force_in_units(p, samples, r->tau, to->tau);
    to->b = r->b, to->b.q = to->q, to->b.qd = r->b.qd ? to->qd : NULL;
    to->b.qdd = r->b.qdd ? to->qdd : NULL, to->b.tau = to->tau;
}

static const roln_loss every = {1, ROLN_C(0.5), ROLN_C(0.75), ROLN_C(0.625), ROLN_C(0.875), ROLN_C(0.375), ROLN_C(0.25),
                                ROLN_C(1.0625), ROLN_C(0.4375), ROLN_C(0.6875)};

/* The gradient g [params] of a recording, from nothing, in blocks of three windows; the loss is returned. */
static roln_real gradient(const pair *p, const instance *m, const recording *r, roln_real *g)
{
    const int k = p->k;
    roln_real windows = 0;
    roln_loss loss = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    const roln_gradient to = roln_gradient_of(m->model, g, &loss, &windows);
    fill(models[k]->params, 0, g);
    if (r->b.qdd) CHECK_OK(roln_grad_acc(m, &every, &r->b, 3, &to, room_of(grad_acc_work(k, 3))));
    else CHECK_OK(roln_grad(m, &every, &r->b, dt / 8, 3, &to, room_of(grad_work(k, 3, 2))));
    ROOM_KEPT();
    CHECK(windows > COUNT - 1 && loss.q >= 0);
    return roln_loss_total(&every, &loss);
}

static void test_losses(int k)
{
    static pair p;
    static recording r[2];
    static roln_real g[2][MAXP], rows[2][COUNT * MAXP], left[2][COUNT];
    uint64_t s = 50 + (uint64_t)k;
    int kind, j;
    pair_of(k, &s, &p);
    for (kind = 0; kind < KINDS; kind++) {
        const roln_rows_to to[2] = {{rows[0], left[0], 0, 5}, {rows[1], left[1], 0, 5}};
        roln_loss var[2];
        roln_real loss[2];
        record(&p, kind, &s, &r[0]), record_in_units(&p, &r[0], &r[1]);
        for (j = 0; j < 2; j++) {
            const instance *m = j ? &p.own : &p.plain;
            loss[j] = gradient(&p, m, &r[j], g[j]);
            CHECK_OK(roln_rows(m, &every, &r[j].b, dt / 8, &to[j], kind == ACC ? room_of(grad_acc_work(k, 1))
                                                                              : room_of(grad_work(k, 1, 2))));
            CHECK_OK(m->of->variance(m, &r[j].b, &var[j], ROOM(variance)));
        }
        CHECK(same(models[k]->params, g[0], g[1]) && same(1, loss, loss + 1) && largest(models[k]->params, g[1]) > 0);
        CHECK(same(COUNT * models[k]->params, rows[0], rows[1]) && same(COUNT, left[0], left[1]));
        CHECK(memcmp(var, var + 1, sizeof *var) == 0);
    }
}

/* Those of all joints are the same, those of each are in its unit. */
static void test_errors(int k)
{
    static pair p;
    static recording r[2];
    roln_real qbar[2][MAXN], range[2][3 * MAXN];
    roln_error e[2][3], joints[2][3 * MAXN];
    uint64_t s = 60 + (uint64_t)k;
    int j, i;
    pair_of(k, &s, &p), record(&p, ODE, &s, &r[0]), record_in_units(&p, &r[0], &r[1]);
    dyadic(p.N, ROLN_C(0.25), &s, qbar[0]), in_units(&p, 1, 1, qbar[0], qbar[1]);
    for (j = 0; j < 2; j++) {
        const instance *m = j ? &p.own : &p.plain;
        const roln_errors_to to = {e[j], joints[j]};
        CHECK_OK(roln_errors(m, &r[j].b, dt / 8, 3, 1, qbar[j], &to, room_of(errors_work(k, 3))));
        ROOM_KEPT();
        CHECK_OK(m->of->fit_range(m, COUNT, r[j].q, r[j].qd, range[j], range[j] + p.n, range[j] + 2 * p.n, ROOM(fit_range)));
    }
    CHECK(memcmp(e[0], e[1], sizeof e[0]) == 0 && e[1][2].q > 0 && same(3 * p.n, range[0], range[1]));
    for (i = 0; i < 3 * p.N; i++) {
        const roln_real by = p.each[i % p.N] * p.each[i % p.N];
        const roln_error want = {joints[0][i].q * (double)by, joints[0][i].q_var * (double)by, joints[0][i].qd * (double)by,
                                 joints[0][i].qd_var * (double)by};
        CHECK(memcmp(&want, &joints[1][i], sizeof want) == 0 && want.q_var > 0);
    }
}

#ifdef ROLN_DOUBLE
/* Units that are no powers of two: along any direction the error of differences of the loss is quartered when the step is
   halved. */
static void test_slope(int k, int kind)
{
    static pair p;
    static recording r;
    static double g[MAXP], unused[MAXP], v[MAXP], theta[MAXP];
    uint64_t s = 70 + (uint64_t)(3 * k + kind);
    double off[2], along = 0;
    int half, i;
    pair_of(k, &s, &p);
    for (i = 0; i < p.N; i++)
        p.each[i] = models[k]->md->lnn.angles >> i & 1 ? 1 : 0.3 + 0.7 * i;
    record(&p, kind, &s, &r), dyadic(models[k]->params, 1, &s, v);
    for (i = 0; i < models[k]->params; i++)
        v[mate(k, i)] = v[i];
    gradient(&p, &p.own, &r, g), memcpy(theta, p.theta, sizeof theta);
    for (i = 0; i < models[k]->params; i++)
        along += g[i] * v[i];
    for (half = 0; half < 2; half++) {
        const double h = half ? 1e-3 : 2e-3;
        double loss[2];
        int side;
        for (side = 0; side < 2; side++) {
            for (i = 0; i < models[k]->params; i++)
                p.theta[i] = theta[i] + (side ? h : -h) * v[i];
            loss[side] = gradient(&p, &p.own, &r, unused);
        }
        off[half] = (loss[1] - loss[0]) / (2 * h) - along;
    }
    BOUND("own units: slope", fabs((4 * off[1] - off[0]) / 3) / (largest(models[k]->params, g) * 10), 1e-6);
    if (fabs(off[0]) > 1e-6 * fabs(along)) BOUND("own units: the error of differences, quartered", fabs(off[0] / off[1] - 4), 0.5);
}
#endif

/* ---- charts ----------------------------------------------------------------------------------- */

enum { FEW = 40 };

/* A bent surface in five joints, and the same with joints in units of their own. */
static void surface(uint64_t *s, const roln_real *each, roln_real *q, roln_real *qd, roln_real *Q, roln_real *Qd)
{
    int i, j;
    for (i = 0; i < FEW; i++) {
        const roln_real a = roln_normal(s), b = roln_normal(s), ad = roln_normal(s), bd = roln_normal(s);
        for (j = 0; j < 5; j++) {
            const roln_real e = ROLN_C(0.25) * (roln_real)(j + 1), f = ROLN_C(0.125) * (roln_real)(2 - j);
            q[i * 5 + j] = e * a + f * b + ROLN_C(0.0625) * a * b, qd[i * 5 + j] = e * ad + f * bd;
            Q[i * 5 + j] = each[j] * q[i * 5 + j], Qd[i * 5 + j] = each[j] * qd[i * 5 + j];
        }
    }
}

static void test_charts(void)
{
    static const roln_real each[5] = {4, ROLN_C(0.125), 2, ROLN_C(0.0625), 8};
    static chart_params p;
    static chart_turn turn;
    static chart_chart sums;
    static chart_start start;
    static charts_params own;
    static charts_turn own_turn;
    static charts_chart own_sums;
    static charts_start own_start;
    roln_real q[5 * FEW], qd[5 * FEW], Q[5 * FEW], Qd[5 * FEW], bar[5], left[2] = {1, 2};
    const roln_batch b = {FEW, 0, 1, NULL, q, qd, NULL, NULL}, own_b = {FEW, 0, 1, NULL, Q, Qd, NULL, NULL};
    uint64_t s = 8;
    int k;
    memset(&turn, 0, sizeof turn), memset(&own_turn, 0, sizeof own_turn), memset(&sums, 0, sizeof sums);
    memset(&own_sums, 0, sizeof own_sums);
    surface(&s, each, q, qd, Q, Qd);
    CHECK_OK(chart_init_pod(&p, FEW, q, qd, bar, &s, &start.init_pod));
    CHECK_OK(charts_init(&own, &s, &own_start.init));
    CHECK(all(5, own.each, 1));
    own.scale = p.scale, memcpy(own.each, each, sizeof each);
    CHECK_OK(roln_ae_init_pod(&charts_model.ae, FEW, Q, 1 / own.scale.q, own.each, own.theta, own_start.init_pod.room,
                              own_start.init_pod.work));
    CHECK(same(charts_ae_size, p.theta, own.theta));
    for (k = 0; k < 3; k++) {
        const roln_status st = chart_chart_turn(&p, &b, &turn, &left[0]);
        CHECK(charts_chart_turn(&own, &own_b, &own_turn, &left[1]) == st && (k > 0 || st == ROLN_OK));
        CHECK(same(charts_ae_size, p.theta, own.theta) && same(1, left, left + 1) && same(2, p.zd_max, own.zd_max));
    }
    CHECK_OK(chart_chart_add(&p, FEW, q, &sums, &start));
    CHECK_OK(charts_chart_add(&own, FEW, Q, &own_sums, &own_start));
    CHECK(memcmp(sums.sums, own_sums.sums, sizeof sums.sums) == 0 && sums.sums[0] > FEW - 1);
    CHECK_OK(charts_init_pod(&own, FEW, Q, Qd, bar, &s, &own_start.init_pod)); /* whatever the units, it finds them */
    for (k = 0; k < 5; k++)
        CHECK(own.each[k] > each[k] / 8 && own.each[k] < 8 * each[k]);
}

/* ---- units of a recording --------------------------------------------------------------------- */

/* each_j is the rms of a joint, 1 of one at rest and of an angle; mean |x|^2 = n. Joints that are not finite have no scale. */
static void test_fit(void)
{
    enum { N = 4, SAMPLES = 1000 };
    roln_model md = alike_model;
    static roln_real q[SAMPLES * N], qd[SAMPLES * N];
    roln_real bar[N], each[N];
    roln_scale sc = {7, 7, 7};
    ld mean = 0, square = 0, rate = 0, x2 = 0;
    uint64_t s = 4;
    int i, j;
    md.ae.size[0] = md.lnn.n = N, md.own = 1;
    dyadic(SAMPLES * N, 1, &s, q), dyadic(SAMPLES * N, 1, &s, qd);
    for (i = 0; i < SAMPLES; i++)
        q[i * N + 1] *= 1000, qd[i * N + 1] *= 1000, q[i * N + 2] = ROLN_C(3.7), qd[i * N + 2] = 0;
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK(all(1, each + 2, 1) && each[1] > 100 && each[0] < 1);
    for (j = 0; j < N; j++) {
        ld x = 0;
        for (mean = 0, i = 0; i < SAMPLES; i++)
            mean += (ld)q[i * N + j] / SAMPLES;
        for (square = 0, i = 0; i < SAMPLES; i++)
            square += ((ld)q[i * N + j] - mean) * ((ld)q[i * N + j] - mean) / SAMPLES;
        if (j != 2) CHECK_NEAR(each[j], sqrtl(square), 20 * EPS * (ld)each[j]);
        for (i = 0; i < SAMPLES; i++)
            x += ((ld)qd[i * N + j] / (ld)each[j]) * ((ld)qd[i * N + j] / (ld)each[j]) / SAMPLES;
        x2 += square / ((ld)each[j] * (ld)each[j] * (ld)sc.q * (ld)sc.q), rate += x / ((ld)sc.q * (ld)sc.q);
    }
    CHECK_NEAR(x2, N, 40 * N * EPS);
    CHECK_NEAR(rate * (ld)sc.t * (ld)sc.t, N, 40 * N * EPS);
    md.lnn.angles = 1; /* the first joint turns round */
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK(all(1, each, 1) && each[1] > 100 && all(1, &sc.q, 1));
    for (mean = 0, i = 0; i < SAMPLES; i++) /* the second is far from its mean, and no turn away */
        mean += (ld)q[i * N + 1] / SAMPLES;
    CHECK_NEAR(bar[1], mean, 1000 * PICK(100, 20) * EPS);
    for (i = 0; i < 2; i++) {
        const roln_real was = q[N + 1], bad[2] = {(roln_real)NAN, (roln_real)INFINITY};
        q[N + 1] = bad[i], sc.q = sc.t = 7;
        CHECK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each) == ROLN_E_NOT_FINITE && all(1, &sc.q, 7) && all(1, &sc.t, 7));
        CHECK(all(1, each + 1, 1));
        q[N + 1] = was;
    }
    fill(SAMPLES * N, 0, q);
    CHECK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each) == ROLN_E_NOT_FINITE && all(N, each, 1));
    for (i = 0; i < SAMPLES; i++)
        q[i * N + 3] = i % 2 ? ROLN_C(1e-3) : -ROLN_C(1e-3); /* about 0 it may be as little as it likes */
    CHECK_OK(roln_fit_scale(&md, SAMPLES, q, qd, bar, &sc, each));
    CHECK_NEAR(each[3], 1e-3, PICK(2e-3, 0.2) * EPS);
}

enum { LONG = 120 };

/* A slider that moves by hundredths beside a hinge that moves by one. */
static void slide(roln_real metre, roln_real *q, roln_real *qd)
{
    int i;
    for (i = 0; i < LONG; i++) {
        const double t = 0.0625 * i;
        q[2 * i] = metre * (roln_real)(0.02 * cos(1.3 * t)), qd[2 * i] = metre * (roln_real)(-0.026 * sin(1.3 * t));
        q[2 * i + 1] = (roln_real)sin(t), qd[2 * i + 1] = (roln_real)cos(t);
    }
}

/* The errors half a second ahead after forty updates, of all joints and of each. */
#define LEARN(of, metre, e, joints, p) \
    do { \
        static of##_optimiser o; \
        static of##_gradient g; \
        static of##_start init; \
        static of##_train train; \
        roln_batch b = {16, 4, 1, start, q, qd, NULL, NULL}; \
        roln_loss weights = ROLN_ODE_WEIGHTS, var = ROLN_ODE_WEIGHTS; \
        uint64_t s = 6; \
        int step; \
        memset(&o, 0, sizeof o); \
        slide(metre, q, qd); \
        CHECK_OK(of##_init_pod(p, LONG, q, qd, bar, &s, &init)); \
        CHECK_OK(of##_variance(p, &b, &var, &train)); \
        roln_loss_divide(&weights, &var); \
        for (step = 0; step < 40; step++) { \
            memset(&g, 0, sizeof g); \
            CHECK_OK(of##_grad(p, &weights, &b, ROLN_C(0.0625), &g, &train)); \
            CHECK_OK(of##_update(p, &opt, &o, &g, &train)); \
        } \
        CHECK_OK(of##_errors(p, &b, ROLN_C(0.0625), 4, bar, e, joints, &train)); \
    } while (0)

/* Metres or millimetres: the same training, to rounding, and where a unit is 2^10 times another to the bit. With one unit for both
   joints it is another training. */
static void test_metres(void)
{
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    static roln_real q[2 * LONG], qd[2 * LONG];
    static rail_params p[3];
    static alike_params one;
    roln_error e[4][2], joints[4][4];
    roln_real bar[2];
    int start[16], i;
    for (i = 0; i < 16; i++)
        start[i] = 7 * i;
    LEARN(rail, 1, e[0], joints[0], &p[0]);
    LEARN(rail, 1024, e[1], joints[1], &p[1]);
    LEARN(rail, 1000, e[2], joints[2], &p[2]);
    CHECK(same(rail_theta_size, p[0].theta, p[1].theta) && memcmp(e[0], e[1], sizeof e[0]) == 0);
    CHECK(p[1].each[0] == 1024 * p[0].each[0] && p[1].each[1] == p[0].each[1] && p[0].each[0] < ROLN_C(0.02));
    CHECK(joints[1][2].q == 1048576 * joints[0][2].q && joints[1][3].q == joints[0][3].q);
    BOUND("own units: metres, millimetres", fabsl((ld)e[2][1].q / (ld)e[0][1].q - 1), PICK(1e-3, 1e-9));
    CHECK_BELOW((ld)joints[0][2].q / (ld)joints[0][2].q_var, 0.05);
    LEARN(alike, 1, e[2], joints[2], &one);
    LEARN(alike, 1024, e[3], joints[3], &one);
    CHECK_BELOW(0.1, fabsl((ld)(e[3][1].q / e[3][1].q_var) / (ld)(e[2][1].q / e[2][1].q_var) - 1));
}

/* ---- kept and refused ------------------------------------------------------------------------- */

static void nothing(void *ctx, const char *piece)
{
    *(int *)ctx += (int)strlen(piece);
}

/* Units of angles are 1: else the numbers are of another model. */
static void test_foreign(void)
{
    static wheels_params p, back;
    static wheels_start start;
    static wheels_work work;
    static unsigned char bytes[wheels_packed_size], plain[wheel_packed_size];
    static wheel_params other;
    const wheels_state x = {{0}, {0}};
    wheels_latent z = {{7}, {7}};
    roln_check c = {0, 0, 0, 0};
    uint64_t s = 3;
    int i, written = 0;
    CHECK_OK(wheels_init(&p, &s, &start.init));
    p.each[1] = ROLN_C(0.3);
    CHECK(!wheels_foreign(&p) && (int)wheels_numbers == (int)wheel_numbers + 3);
    wheels_pack(&p, bytes);
    CHECK(wheels_unpack(wheels_packed_size, bytes, &back) == ROLN_OK && memcmp(&p, &back, sizeof p) == 0);
    memcpy(plain, bytes, sizeof plain);
    CHECK(wheel_unpack(wheel_packed_size, plain, &other) == ROLN_E_SHAPE);
    memset(&other, 0, sizeof other), wheel_pack(&other, plain), memcpy(bytes, plain, sizeof plain);
    CHECK(wheels_unpack(wheels_packed_size, bytes, &back) == ROLN_E_SHAPE);
    CHECK(wheels_check(&p, wheels_numbers, &c) == ROLN_OK);
    p.each[1] *= 2; /* a part of what is checked */
    CHECK(wheels_check(&p, wheels_numbers, &c) == ROLN_E_CHECKSUM);
    for (i = 0; i < 3; i += 2) {
        p.each[i] = ROLN_C(0.5);
        CHECK(wheels_foreign(&p) && wheels_encode(&p, &x, &z, &work) == ROLN_E_SHAPE && all(1, z.z, 7));
        CHECK(wheels_write(&p, nothing, &written) == ROLN_E_SHAPE && written == 0);
        wheels_pack(&p, bytes);
        CHECK(wheels_unpack(wheels_packed_size, bytes, &back) == ROLN_E_SHAPE);
        p.each[i] = 1;
    }
    CHECK(!wheels_foreign(&p) && wheels_write(&p, nothing, &written) == ROLN_OK && written > 0);
}

#ifndef ROLN_DOUBLE
/* Weights stored small keep the units. */
static void test_store(void)
{
    static geared_params p;
    static geared8_params a;
    static geared_start start;
    static geared8_start store;
    static geared_work work;
    static geared8_work work8;
    static unsigned char bytes[geared_packed_size];
    float q[24], qd[24];
    geared_state x, y;
    geared8_state y8;
    geared_latent z;
    geared8_latent z8;
    uint64_t s = 12;
    int i;
    CHECK_OK(geared_init(&p, &s, &start.init));
    for (i = 0; i < 6; i++)
        p.each[i] = 0.3f + 20 * (float)i;
    dyadic(24, 1, &s, q), dyadic(24, 1, &s, qd);
    for (i = 0; i < 24; i++)
        q[i] *= p.each[i % 6], qd[i] *= p.each[i % 6];
    CHECK_OK(geared_fit_range(&p, 4, q, qd, &work));
    p.dt = dt;
    geared_pack(&p, bytes);
    CHECK_OK(geared8_store(geared_packed_size, bytes, &a, &store));
    CHECK(same(6, a.each, p.each) && same(1, &a.dt, &p.dt) && memcmp(&a.scale, &p.scale, sizeof a.scale) == 0);
    CHECK(same(2, a.z_min, p.z_min) && same(2, a.z_max, p.z_max) && same(2, a.zd_max, p.zd_max));
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    CHECK_OK(geared_encode(&p, &x, &z, &work));
    memcpy(&z8, &z, sizeof z8);
    CHECK_OK(geared_decode(&p, &z, &y, &work));
    CHECK_OK(geared8_decode(&a, &z8, &y8, &work8));
    for (i = 0; i < 6; i++)
        CHECK_NEAR(y8.q[i] / p.each[i], y.q[i] / p.each[i], 0.1);
}
#endif

void TEST_NAME(units)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_states(k);
        test_forces(k);
        test_feedback(k);
        test_estimates(k);
        test_ticks(k);
        test_losses(k);
        test_errors(k);
#ifdef ROLN_DOUBLE
        test_slope(k, ODE), test_slope(k, ACC), test_slope(k, POSITIONS);
#endif
    }
    test_charts();
    test_fit();
    test_metres();
    test_foreign();
#ifndef ROLN_DOUBLE
    test_store();
#endif
    print_bounds();
}
