/* SPDX-License-Identifier: MIT */
/* Plans (roln.h section 13): gradients of the cost against differences, feedback against NAME_lqr_along, limits, costs and states
   against steps of the model by hand, derivatives that are kept, limits that are never reached, units of motors, what a tick makes
   of a plan, its linearisation, and what is refused. */

#include <limits.h>

/* The small models with a load that their filters estimate. */
#define CALLED(X) X(filter_tick)
#define SMALL(name) name##_loaded
#define SMALL_LOAD 1
#include "small_models.h"

#undef CALLED
#define CALLED(X) \
    X(decode) X(lift) X(inverse) X(allocate) X(push) X(lqr_along) X(guard_tick) X(in_range) X(plan_next) X(plan_follow) \
    X(plan_linear)
#define CALLED_ALSO "plan_inside.h"
#include "small.h"

void TEST_NAME(plan)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

#define LOADED_CALLED(name) name##_loaded_called
#define INSIDE(name) name##_inside
static const model *const with_load[MODELS] = SMALL_TABLE(LOADED_CALLED, LOADED_CALLED);
static const plan_inside *const inside[MODELS] = SMALL_TABLE(INSIDE, INSIDE);

enum { STEPS = 4, TERMS = 5, MAXM = 5, ROWS = 2 };

static roln_real theta[MAXP];

/* A model, what is asked of its plan, and the plan. */
typedef struct {
    int k;
    roln_real s[2 * MAXN], low[MAXN], high[MAXN], fast[MAXN], B[MAXN * 2], tau[MAXM], rate[MAXM], u[MAXM], hold[MAXM];
    roln_real C[TERMS][ROWS * MAXN], weight[TERMS][MAXN], ref[TERMS][STEPS * MAXN], P[4 * MAXN * MAXN], end[2 * MAXN];
    roln_real path[(STEPS + 1) * 2 * MAXN], torque[STEPS * MAXM], K[STEPS * MAXM * 2 * MAXN], load[MAXN];
    roln_term term[TERMS];
    roln_motors motors;
    roln_limits limits;
    roln_goal goal;
    roln_plan plan;
} task;

static instance model_of(const task *x)
{
    instance m = trained(models[x->k], scale_of(x->k), theta);
    m.z_min = x->low, m.z_max = x->high, m.zd_max = x->fast;
    return m;
}

static plan_at planned(task *x)
{
    const plan_at pl = {.plan = &x->plan, .s = x->path, .u = x->torque, .K = x->K};
    return pl;
}

/* What points to numbers of x, after a copy. */
static void point(task *x)
{
    int i;
    for (i = 0; i < TERMS; i++) {
        x->term[i].weight = x->weight[i], x->term[i].ref = x->ref[i];
        if (x->term[i].C) x->term[i].C = x->C[i];
    }
    if (x->limits.motors) x->limits.motors = &x->motors;
    x->motors.B = models[x->k]->md->inputs > 0 ? NULL : x->B, x->limits.tau_each = x->tau;
    if (x->limits.rate_each) x->limits.rate_each = x->rate;
    x->goal.term = x->term, x->goal.u = x->u, x->goal.hold = x->hold, x->goal.limits = &x->limits;
    if (x->goal.P) x->goal.P = x->P, x->goal.end = x->end;
    if (x->goal.load) x->goal.load = x->load;
}

/* Joints, joint velocities by two outputs, latent coordinates, latent velocities, joints by two outputs; a cost behind the end; of
   every second model a load. Where the model has learned what its motors do, some name their number and others do not. */
static void place(int k, uint64_t *s, task *x)
{
    static const int of[TERMS] = {ROLN_OF_Q, ROLN_OF_QD, ROLN_OF_Z, ROLN_OF_ZD, ROLN_OF_Q};
    const int n = n_OF(k), inputs = models[k]->md->inputs;
    int i, j;
    memset(x, 0, sizeof *x);
    x->k = k;
    parameters(k, s, theta);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta, s, spare));
    fill(MAXN, -100, x->low), fill(MAXN, 100, x->high), fill(MAXN, 100, x->fast);
    dyadic(2 * n, ROLN_C(0.25), s, x->s), dyadic(MAXN * 2, 1, s, x->B), dyadic(MAXM, ROLN_C(0.125), s, x->hold);
    for (i = 0; i < TERMS; i++) {
        dyadic(ROWS * MAXN, 1, s, x->C[i]), dyadic(MAXN, ROLN_C(0.5), s, x->weight[i]), dyadic(STEPS * MAXN, 1, s, x->ref[i]);
        for (j = 0; j < MAXN; j++)
            x->weight[i][j] = ROLN_ABS(x->weight[i][j]);
        x->term[i].of = of[i], x->term[i].moving = i % 2, x->term[i].last = i == 2;
        x->term[i].C = i == 1 || i == 4 ? x->C[i] : NULL, x->term[i].count = x->term[i].C ? ROWS : 0;
    }
    for (i = 0; i < 2 * n; i++)
        x->P[i * (2 * n + 1)] = ROLN_C(0.5);
    for (i = 0; i < MAXM; i++)
        x->tau[i] = ROLN_C(0.5) + ROLN_C(0.25) * (roln_real)i, x->rate[i] = 4, x->u[i] = ROLN_C(0.25);
    x->motors.count = 2, x->limits.dt = dt, x->limits.margin = 1;
    x->limits.motors = models[k]->md->actuator == ROLN_SERVO || (inputs > 0 && k % 2) ? NULL : &x->motors;
    x->goal.dt = dt, x->goal.terms = TERMS, x->goal.P = x->P;
    if (k % 2 == 0) dyadic(n, 1, s, x->load), x->goal.load = x->load;
    point(x);
}

/* The cost by hand, of states path [STEPS + 1][2n] and torques u. */
static ld cost_of(const task *x, const instance *m, const roln_real *path, const roln_real *u)
{
    const int n = n_OF(x->k), N = N_OF(x->k), motors = models[x->k]->motors;
    roln_real q[2 * MAXN];
    ld sum = 0;
    int k, t, i, j;
    for (k = 0; k < STEPS; k++) {
        const roln_real *s = path + (k + 1) * 2 * n;
        CHECK_OK(m->of->decode(m, s, s + n, q, q + N, spare));
        for (t = 0; t < TERMS; t++) {
            const roln_term *f = x->term + t;
            const int side = f->of == ROLN_OF_Q || f->of == ROLN_OF_QD ? N : n;
            const roln_real *at = f->of == ROLN_OF_Q ? q : f->of == ROLN_OF_QD ? q + N : f->of == ROLN_OF_Z ? s : s + n;
            const int count = f->C ? f->count : side;
            for (i = 0; i < count; i++) {
                ld y = f->C ? 0 : (ld)at[i];
                for (j = 0; j < side && f->C; j++)
                    y += (ld)f->C[i * side + j] * (ld)at[j];
                y -= (ld)f->ref[(f->moving ? k * count : 0) + i];
                if (!f->C && i < n && (f->of == ROLN_OF_Q || f->of == ROLN_OF_Z) && roln_lnn_angle(&m->of->md->lnn, i))
                    y = remainderl(y, 2 * 3.14159265358979323846264338327950288L);
                sum += y * y * (ld)f->weight[i] * (k == STEPS - 1 ? 1 + (ld)f->last : 1);
            }
        }
        for (i = 0; i < 2 * n && k == STEPS - 1 && x->goal.P; i++) {
            ld e = (ld)s[i] - (ld)x->end[i];
            if (i < n && roln_lnn_angle(&m->of->md->lnn, i)) e = remainderl(e, 2 * 3.14159265358979323846264338327950288L);
            sum += e * e * (ld)x->P[i * (2 * n + 1)];
        }
        for (j = 0; j < motors; j++) {
            const ld e = (ld)u[k * motors + j] - (ld)x->hold[j];
            sum += (ld)x->u[j] * e * e;
        }
    }
    return sum;
}

/* A step of the model under the motors' torque u, and the load. */
static roln_status step(const task *x, const instance *m, const roln_real *u, roln_real *s)
{
    roln_real tau[MAXN];
    int i;
    for (i = 0; i < N_OF(x->k) && x->motors.B; i++)
        tau[i] = x->B[2 * i] * u[0] + x->B[2 * i + 1] * u[1];
    return m->of->push(m, s, s + n_OF(x->k), x->motors.B ? tau : u, x->goal.load, x->goal.dt, spare);
}

/* ---- what is inside of a call ----------------------------------------------------------------- */

/* The scratch of NAME_plan_next for x, at its start. */
static roln_real *lay(task *x, const plan_at *pl, plan_arrays *b)
{
    const int k = x->k;
    roln_real *const work = ROOM(plan_next);
    inside[k]->start(&x->goal, pl, x->s, work, b);
    return work;
}

/* The gradient of the cost by all torques, by way of A, B and q, against central differences, of which half the step makes a
   quarter of the error. */
static void test_gradient(int k)
{
    static task x;
    static ld g[STEPS * MAXM];
    const int n2 = 2 * n_OF(k), motors = models[k]->motors;
    uint64_t s = 20 + (uint64_t)k;
    plan_at pl;
    instance m;
    plan_arrays plan;
    roln_real *work;
    roln_real cost;
    ld p[2 * MAXN], v[2 * MAXN], top = 0;
    int i, j, l, in;
    place(k, &s, &x);
    pl = planned(&x), m = model_of(&x);
    work = lay(&x, &pl, &plan);
    dyadic(STEPS * motors, ROLN_C(0.5), &s, plan.u0);
    if (!CHECK_OK(inside[k]->base(&m, &x.goal, NULL, &cost, &in, work))) return;
    CHECK(in);
    for (i = 0; i < n2; i++)
        v[i] = 0;
    for (l = STEPS - 1; l >= 0; l--) {
        for (i = 0; i < n2; i++)
            p[i] = v[i] + (ld)plan.q[l * n2 + i];
        for (j = 0; j < motors; j++) {
            ld sum = (ld)plan.r[j] * ((ld)plan.u0[l * motors + j] - (ld)plan.hold[j]);
            for (i = 0; i < n2; i++)
                sum += (ld)plan.B[(l * n2 + i) * motors + j] * p[i];
            g[l * motors + j] = sum;
            top = fabsl(sum) > top ? fabsl(sum) : top;
        }
        for (j = 0; j < n2; j++)
            for (v[j] = 0, i = 0; i < n2; i++)
                v[j] += (ld)plan.A[(l * n2 + i) * n2 + j] * p[i];
    }
    for (i = 0; i < STEPS * motors; i++) {
        const roln_real at = plan.u0[i], h = PICK(ROLN_C(0.0625), ROLN_C(0.0009765625));
        roln_real of[4];
        ld d[2], error[3];
        for (j = 0; j < 4; j++) {
            plan.u0[i] = at + (j % 2 ? -h : h) / (roln_real)(1 + j / 2);
            CHECK_OK(inside[k]->base(&m, &x.goal, NULL, of + j, &in, work));
        }
        plan.u0[i] = at;
        for (j = 0; j < 2; j++)
            d[j] = ((ld)of[2 * j] - (ld)of[2 * j + 1]) / (2 * (ld)h / (1 + j)), error[j] = fabsl(d[j] - g[i]);
        error[2] = fabsl((4 * d[1] - d[0]) / 3 - g[i]); /* which is of fourth order */
        BOUND("gradient", error[2] / (top + (ld)cost), PICK(2e-4L, 1e-10L));
        if (PICK(0, 1) && error[0] > 1e-8L * (top + (ld)cost)) BOUND("gradient, slope", fabsl(error[0] / error[1] - 4), 0.5L);
    }
}

/* Derivatives that are kept serve a step of the same model if no number has moved too far. They expect the state to + d after it,
   d = A (s0 - at) + B (u0 - at). */
static void test_near(int k)
{
    static task x;
    const int n = n_OF(k), n2 = 2 * n, motors = models[k]->motors;
    uint64_t s = 40 + (uint64_t)k;
    roln_real to[2 * MAXN], d[2 * MAXN];
    plan_at pl;
    instance m;
    plan_arrays b;
    roln_real *work;
    int l, i, j;
    place(k, &s, &x);
    pl = planned(&x), m = model_of(&x);
    work = lay(&x, &pl, &b);
    dyadic(STEPS * n2 * n2, 1, &s, b.A), dyadic(STEPS * n2 * motors, 1, &s, b.B), dyadic(STEPS * (n2 + motors), 1, &s, b.at);
    dyadic(STEPS * n2, 1, &s, b.to), dyadic(STEPS * n2, 1, &s, b.s0), dyadic(STEPS * motors, 1, &s, b.u0);
    for (l = 0; l < STEPS; l++) {
        roln_real *const s0 = b.s0 + l * n2, *const u0 = b.u0 + l * motors, *const at = b.at + l * (n2 + motors);
        CHECK(!inside[k]->expects(&m, l, 2, to, d, work) && inside[k]->expects(&m, l, 1, to, d, work));
        for (i = 0; i < n2; i++) {
            ld sum = 0, size = 1;
            for (j = 0; j < n2 + motors; j++) {
                const ld part = j < n2 ? (ld)b.A[(l * n2 + i) * n2 + j] * ((ld)s0[j] - (ld)at[j])
                                       : (ld)b.B[(l * n2 + i) * motors + j - n2] * ((ld)u0[j - n2] - (ld)at[j]);
                sum += part, size += fabsl(part);
            }
            BOUND("near: d (eps)", fabsl((ld)d[i] - sum) / (size * EPS), 4);
            BOUND("near: x (eps)", fabsl((ld)to[i] - (ld)b.to[l * n2 + i] - sum) / (size * EPS), 4);
        }
        for (i = 0; i < n2 + motors; i++) { /* 1/16 of what was seen: z of -100 to 100, zd up to 100 */
            const roln_real was = at[i];
            if (i < n2) {
                const roln_real far = i < n ? ROLN_C(12.5) : ROLN_C(6.25);
                at[i] = s0[i] - far;
                CHECK(inside[k]->expects(&m, l, 1, to, d, work));
                at[i] = s0[i] + far * ROLN_C(1.01);
            } else {
                for (j = n; j < n2; j++) /* any velocity */
                    if (ROLN_ABS(b.B[(l * n2 + j) * motors + i - n2]) >= ROLN_C(0.125)) break;
                if (j == n2) continue;
                at[i] = u0[i - n2] + 1000;
            }
            CHECK(!inside[k]->expects(&m, l, 1, to, d, work));
            at[i] = was;
        }
    }
}

/* The feedback of a plan that no limit touches is that of NAME_lqr_along, on its base. */
static void test_feedback(int k)
{
    static task x;
    static roln_real path[(STEPS + 1) * 2 * MAXN], u[STEPS * MAXM], Q[4 * MAXN * MAXN], mine[STEPS * MAXM * 2 * MAXN];
    const int n2 = 2 * n_OF(k), motors = models[k]->motors, count = STEPS * motors * n2;
    uint64_t s = 40 + (uint64_t)k;
    plan_at pl;
    instance m;
    roln_cost lqr;
    plan_arrays plan;
    roln_real *work;
    roln_real cost, gap;
    int i, in;
    place(k, &s, &x);
    if (models[k]->md->lnn.friction) return; /* which NAME_lqr_along leaves out */
    x.goal.load = NULL; /* of which it does not know */
    fill(MAXM, 1000, x.tau);
    x.term[1].C = NULL, x.goal.terms = 2;
    pl = planned(&x), m = model_of(&x);
    work = lay(&x, &pl, &plan);
    if (!CHECK_OK(inside[k]->base(&m, &x.goal, &pl, &cost, &in, work))) return;
    CHECK_OK(inside[k]->solve(&x.goal, &gap, work));
    rolni_copy(STEPS * motors, plan.u0, u);
    for (i = 0; i < n2 * n2; i++)
        Q[i] = plan.Q[(STEPS - 1) * n2 * n2 + i] / 2; /* what is paid at the end */
    rolni_copy(count, plan.K, mine);
    rolni_copy((STEPS + 1) * n2, plan.s0, path);
    lqr.q = x.weight[0], lqr.qd = x.weight[1], lqr.u = x.u, lqr.dt = dt, lqr.motors = x.limits.motors;
    CHECK_OK(m.of->lqr_along(&m, &lqr, STEPS, path, u, Q, x.K, spare));
    BOUND("feedback", furthest(count, mine, x.K) / (1 + largest(count, x.K)), PICK(5e-6L, 1e-11L));
}

/* ---- derivatives that are kept ---------------------------------------------------------------- */

/* Steps of the last call whose derivatives it made. */
static int made_anew(const plan_arrays *b, int n2, int motors)
{
    int k, count = 0;
    for (k = 0; k < STEPS; k++) {
        const roln_real *at = b->at + k * (n2 + motors);
        count += memcmp(at, b->s0 + k * n2, (size_t)n2 * sizeof *at) == 0 &&
                 memcmp(at + n2, b->u0 + k * motors, (size_t)motors * sizeof *at) == 0;
    }
    return count;
}

/* A plan of x, made once, and changed so that it leads to where the derivatives of its second step were computed: x->s hardly
   differs from that state, and the torque is that one. NULL: the steps are too long for the midpoint rule, or nothing is kept. */
static roln_real *plan_once(task *x, instance *m, plan_arrays *b, roln_plan *made)
{
    const int n2 = 2 * n_OF(x->k), motors = models[x->k]->motors;
    const plan_at pl = planned(x);
    roln_real *work;
    *m = model_of(x);
    work = lay(x, &pl, b);
    if (inside[x->k]->next(m, &x->goal, x->s, work, made) != ROLN_OK) return CHECK(x->k == PUSHED), NULL;
    CHECK(made_anew(b, n2, motors) == STEPS);
    rolni_copy(n2, b->at + n2 + motors, x->s);
    rolni_copy(n2, x->s, b->s + n2);
    rolni_copy(motors, b->at + 2 * n2 + motors, b->u + motors);
    x->s[0] += ROLN_C(0.0000152587890625);
    return b->of[1] != 0 ? work : NULL;
}

enum { KEPT = 9 };

/* Change number `what`, after 0 of which derivatives of the first step hold. Returns whether there is such a change. */
static int turn_away(int what, task *x, plan_arrays *b)
{
    const int n = n_OF(x->k), motors = models[x->k]->motors;
    switch (what) {
    case 0: return 1;
    case 1: x->s[0] += 1; return 1;
    case 2: x->s[n] -= 1; return 1;
    case 3: theta[0] += ROLN_C(0.0009765625); return 1;
    case 4: x->goal.dt *= ROLN_C(1.0009765625); return 1;
    case 5: x->B[0] += ROLN_C(0.0009765625); return x->motors.B != NULL;
    case 6: /* the torque alone */
        fill(n, ROLN_C(0.001), x->fast);
        return b->u[motors] = b->u[motors] > 0 ? -x->tau[0] : x->tau[0], 1;
    case 7: return x->load[0] = PICK(ROLN_C(3e38), ROLN_C(1e38) * ROLN_C(1e38) * ROLN_C(1e200)), x->goal.load != NULL;
    default: x->load[0] += 8; return x->goal.load != NULL;
    }
}

/* Derivatives of a step are those of the step before in the next call, if its state, its torque and the model hardly move. Returns
   whether there were any. */
static int test_kept(int k)
{
    static task good, x;
    static roln_real A[STEPS * 4 * MAXN * MAXN];
    const int n2 = 2 * n_OF(k), stage = n2 * n2;
    uint64_t s = 50 + (uint64_t)k;
    int what;
    place(k, &s, &good);
    fill(MAXN, -4, good.low), fill(MAXN, 4, good.high), fill(MAXN, 4, good.fast), good.limits.margin = ROLN_C(1e6);
    for (what = 0; what < KEPT; what++) {
        plan_arrays b;
        instance m;
        roln_plan made;
        roln_real *work;
        roln_status st;
        const roln_real theta0 = theta[0];
        x = good;
        point(&x);
        if (!(work = plan_once(&x, &m, &b, &made))) return 0;
        rolni_copy(STEPS * stage, b.A, A);
        if (turn_away(what, &x, &b)) {
            m = model_of(&x);
            st = inside[k]->next(&m, &x.goal, x.s, work, &made);
            if (what == 0) {
                CHECK_OK(st);
                CHECK(memcmp(b.A, A + stage, (size_t)stage * sizeof *A) == 0);
                CHECK(memcmp(b.at, b.s0, (size_t)n2 * sizeof *A) != 0);
            } else if (what == 7) CHECK(st != ROLN_OK && made.valid && made.age == 1);
            else if (!CHECK(st == ROLN_OK && memcmp(b.at, b.s0, (size_t)n2 * sizeof *A) == 0))
                printf("    %s, %d\n", models[k]->name, what);
        }
        theta[0] = theta0;
    }
    return 1;
}

/* Derivatives that are wrong lead to no plan that is worse than the last one, and are not kept. Returns whether they were found. */
static int test_kept_wrong(int k)
{
    static task x;
    const int n2 = 2 * n_OF(k), motors = models[k]->motors;
    uint64_t s = 55 + (uint64_t)k;
    plan_arrays b;
    instance m;
    roln_plan made;
    roln_real *work;
    int i, kept = 0;
    place(k, &s, &x);
    x.limits.margin = ROLN_C(1e6), x.goal.load = NULL;
    if (!(work = plan_once(&x, &m, &b, &made))) return 0;
    CHECK_OK(inside[k]->next(&m, &x.goal, x.s, work, &made));
    rolni_copy(n2, b.s + n2, x.s);
    if (b.of[0] == 0) return 0;
    for (i = 0; i < STEPS; i++) { /* of the plan itself, but that torques seem to push backward */
        roln_real *const at = b.at + i * (n2 + motors);
        rolni_copy(n2, b.s + i * n2, at), rolni_copy(motors, b.u + i * motors, at + n2);
    }
    for (i = 0; i < STEPS * n2 * motors; i++)
        b.B[i] *= -1;
    for (i = 0; i < STEPS * n2; i++)
        b.to[i] = b.s[n2 + i];
    CHECK_OK(inside[k]->next(&m, &x.goal, x.s, work, &made));
    for (i = 0; i < STEPS; i++)
        kept += b.of[i] != 0;
    CHECK(kept == 0 || kept == STEPS);
    if (kept > 0) return 0;
    CHECK_OK(inside[k]->next(&m, &x.goal, b.s + n2, work, &made));
    CHECK(made_anew(&b, n2, motors) == STEPS);
    return 1;
}

/* ---- plans in a loop -------------------------------------------------------------------------- */

/* Plan after plan: torques and their changes within limits as numbers of the machine are, states those of the model, costs those by
   hand, and none is worse than to go on with the last one. Returns how many plans touch a limit. */
static int run(task *x, const instance *m, int calls)
{
    static roln_real old[(STEPS + 1) * 2 * MAXN], u[STEPS * MAXM], K[STEPS * MAXM * 2 * MAXN];
    const int k = x->k, n2 = 2 * n_OF(k), motors = models[k]->motors;
    const plan_at pl = planned(x);
    int call, l, i, j, touched = 0;
    for (call = 0; call < calls; call++) {
        roln_real last[MAXM], to[2 * MAXN];
        ld before;
        int touch = 0, can = 1;
        for (j = 0; j < motors; j++)
            last[j] = call > 0 ? x->torque[j] : x->hold[j];
        rolni_copy(n2, x->s, old);
        for (l = 0; l < STEPS; l++) { /* the last plan, a step on, with its feedback */
            for (j = 0; j < motors; j++) {
                const roln_real top = x->tau[j], rate = x->limits.rate_each ? x->rate[j] * x->goal.dt : 4 * top;
                const roln_real w = l > 0 ? u[(l - 1) * motors + j] : last[j];
                roln_real v = call > 0 ? x->torque[ROLN_MIN(l + 1, STEPS - 1) * motors + j] : x->hold[j];
                for (i = 0; i < n2 && call > 0 && l + 1 < STEPS; i++) {
                    const roln_real d = old[l * n2 + i] - x->path[(l + 1) * n2 + i];
                    v -= x->K[((l + 1) * motors + j) * n2 + i] * d;
                }
                v = v > w + rate ? w + rate : v < w - rate ? w - rate : v;
                u[l * motors + j] = v > top ? top : v < -top ? -top : v;
            }
            rolni_copy(n2, old + l * n2, old + (l + 1) * n2);
            can &= step(x, m, u + l * motors, old + (l + 1) * n2) == ROLN_OK;
        }
        if (!can) return touched; /* the midpoint rule may find a step too long */
        before = cost_of(x, m, old, u);
        if (!CHECK_OK(m->of->plan_next(m, &x->goal, x->s, &pl, ROOM(plan_next)))) return touched;
        ROOM_KEPT();
        CHECK(x->plan.valid == 1 && x->plan.age == 0 && x->plan.duality_gap >= 0);
        rolni_copy(n2, x->s, to);
        for (l = 0; l < STEPS; l++) {
            for (j = 0; j < motors; j++) {
                const roln_real v = x->torque[l * motors + j], w = l > 0 ? x->torque[(l - 1) * motors + j] : last[j];
                CHECK(ROLN_ABS(v) <= x->tau[j]);
                if (x->limits.rate_each) CHECK_BELOW(ROLN_ABS(v - w), x->rate[j] * x->goal.dt * (1 + 4 * ROLN_EPS) + 4 * ROLN_EPS);
                touch |= ROLN_ABS(v) > ROLN_C(0.99) * x->tau[j];
                touch |= x->limits.rate_each && ROLN_ABS(v - w) > ROLN_C(0.99) * x->rate[j] * x->goal.dt;
            }
            CHECK_OK(step(x, m, x->torque + l * motors, to));
            BOUND("states of a plan", furthest(n2, to, x->path + (l + 1) * n2) / (1 + largest(n2, to)), PICK(1e-5L, 1e-14L));
        }
        BOUND("cost of a plan", fabsl(cost_of(x, m, x->path, x->torque) / (ld)x->plan.cost - 1), PICK(1e-5L, 1e-14L));
        BOUND("not worse", (ld)x->plan.cost / before - 1, PICK(1e-5L, 1e-14L));
        touched += touch;
        memcpy(K, x->K, sizeof K);
        CHECK(roln_all_finite(STEPS * motors * n2, K));
        rolni_copy(n2, x->path + n2, x->s);
        x->s[0] += ROLN_C(0.0625), x->s[n2 - 1] -= ROLN_C(0.03125); /* somebody pushes */
    }
    return touched;
}

static void test_loop(int k)
{
    static task x;
    uint64_t s = 60 + (uint64_t)k;
    int rated, tight, touched = 0;
    for (tight = 0; tight < 2; tight++)
        for (rated = 0; rated < 2; rated++) {
            instance m;
            int i;
            place(k, &s, &x);
            for (i = 0; i < MAXM && tight; i++)
                x.tau[i] /= 8, x.hold[i] /= 8, x.u[i] = ROLN_C(0.0009765625);
            x.limits.rate_each = rated ? x.rate : NULL;
            x.goal.iterations = tight ? 0 : 10;
            m = model_of(&x);
            touched += run(&x, &m, 12);
        }
    if (k == PLAIN || k == WHEEL) CHECK(touched > 12);
}

/* A limit of torque that is never reached, up to the largest number: the same cost and torques, the same bits once the rate alone
   keeps torques below it. A motor that is at its limit beside one that never is, too. */
static void test_far(int k)
{
    static const double times[6] = {2, 10, 1e3, 1e6, 1e9, 0};
    static task first, x;
    const int motors = models[k]->motors, count = STEPS * motors;
    uint64_t s = 70 + (uint64_t)k;
    roln_real far[MAXM], torque[STEPS * MAXM];
    int rated, bound, i, j, l;
    place(k, &s, &first);
    for (rated = 0; rated < 2; rated++)
        for (bound = 0; bound < 2; bound++) { /* motor 0 at its limit */
            plan_at pl = planned(&first);
            instance m;
            ld cost = 0;
            first.limits.rate_each = rated ? first.rate : NULL, first.goal.iterations = 30, first.plan.valid = 0;
            point(&first);
            m = model_of(&first);
            fill(MAXM, 1000, first.tau);
            for (i = 0; i <= 6; i++) {
                roln_status st;
                x = first;
                point(&x);
                pl = planned(&x);
                for (j = 0; j < motors && i > 0; j++)
                    x.tau[j] = i < 6 ? far[j] * (roln_real)times[i - 1] : (roln_real)PICK(3e38, 1e308);
                if (bound) x.tau[0] = ROLN_C(0.125);
                st = m.of->plan_next(&m, &x.goal, x.s, &pl, spare);
                if (i == 0 && st != ROLN_OK) break; /* the midpoint rule may find a step too long */
                if (!CHECK(st == ROLN_OK)) continue;
                for (j = 0; j < motors && i == 0; j++) {
                    const roln_real reach = ROLN_ABS(x.hold[j]) + x.rate[j] * dt * (STEPS + 1);
                    far[j] = rated ? reach : ROLN_C(0.0009765625);
                    for (l = 0; l < STEPS; l++)
                        far[j] = ROLN_MAX(far[j], ROLN_ABS(x.torque[l * motors + j]));
                }
                if (i == 1) rolni_copy(count, x.torque, torque), cost = (ld)x.plan.cost;
                if (i < 2) continue;
                BOUND("far: cost", fabsl((ld)x.plan.cost / cost - 1), PICK(1e-5L, 1e-13L));
                for (j = 0; j < count; j++)
                    BOUND("far: torque", fabsl((ld)x.torque[j] - (ld)torque[j]) / (1 + (ld)far[j % motors]), PICK(1e-4L, 1e-12L));
                if (rated && !bound) CHECK(memcmp(torque, x.torque, sizeof(roln_real) * (size_t)count) == 0);
            }
        }
}

/* What the guard and a plan make of limits that are off: as docs/control.md says, and by the largest number. */
static void test_off(int k)
{
    const roln_real top = (roln_real)PICK(3.4e38, 1.7e308);
    static task x;
    const int N = N_OF(k), n = n_OF(k), motors = models[k]->motors;
    uint64_t s = 78 + (uint64_t)k;
    int way, tick, j;
    place(k, &s, &x);
    for (way = 0; way < 2; way++) {
        const roln_real off = way ? top : 0;
        roln_limits l = {.dt = dt,
                         .margin = way ? top : 1000,
                         .residual = off,
                         .tau = way ? top : ROLN_C(1e9),
                         .q_tolerance = off,
                         .qd_tolerance = off,
                         .residual_window = way ? 1000000000 : 0,
                         .strict = 1,
                         .rate = off,
                         .motors = x.limits.motors};
        roln_guard g = {.valid = 0};
        roln_real q[2 * MAXN], tau[MAXN] = {0};
        const guard_at held = {&g, tau};
        plan_at pl = planned(&x);
        instance m = model_of(&x);
        roln_status st;
        CHECK_OK(m.of->decode(&m, x.s, x.s + n, q, q + N, spare));
        for (tick = 0; tick < 3; tick++) { /* strict, from end to end */
            roln_real want[MAXM];
            for (j = 0; j < motors; j++)
                want[j] = (tick % 2 ? -1 : 1) * ROLN_C(1e8);
            CHECK(m.of->guard_tick(&m, &l, q, q + N, x.s, x.s + n, want, &held, spare) == 0);
            CHECK(memcmp(tau, want, sizeof(roln_real) * (size_t)motors) == 0);
        }
        x.goal.limits = &l, x.plan.valid = 0;
        st = m.of->plan_next(&m, &x.goal, x.s, &pl, spare);
        CHECK(st == ROLN_OK || st == ROLN_E_NO_CONVERGENCE); /* midpoint: too long */
        if (st == ROLN_OK) CHECK_OK(m.of->plan_follow(&m, &x.goal, &pl, 0, x.s, tau));
    }
}

/* Motors in other units, with their limits, rates and weights, over twelve decades: by powers of two the same bits. */
static void test_motor_units(int k)
{
    static task first, x;
    const int motors = models[k]->motors;
    uint64_t s = 75 + (uint64_t)k;
    int trial, i, j;
    place(k, &s, &first);
    if (!first.motors.B) return; /* whose motors are learned */
    for (trial = 0; trial < 8; trial++) {
        plan_at pl = planned(&first);
        instance m = model_of(&first);
        roln_real by[2];
        roln_status st;
        for (j = 0; j < 2; j++)
            by[j] = (roln_real)(trial % 2 ? ldexp(1, roln_randint(41, &s) - 20) : pow(10, roln_randint(13, &s) - 6));
        first.limits.rate_each = trial / 2 % 2 ? first.rate : NULL;
        first.plan.valid = 0, first.goal.iterations = trial < 4 ? 0 : 20;
        point(&first);
        x = first;
        point(&x);
        st = m.of->plan_next(&m, &first.goal, first.s, &pl, spare);
        for (j = 0; j < 2; j++) {
            x.tau[j] *= by[j], x.rate[j] *= by[j], x.hold[j] *= by[j], x.u[j] /= by[j] * by[j];
            for (i = 0; i < MAXN; i++)
                x.B[2 * i + j] /= by[j];
        }
        pl = planned(&x), m = model_of(&x);
        if (!CHECK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare) == st) || st != ROLN_OK) continue;
        BOUND(trial % 2 ? "units of two: cost" : "units: cost", fabsl((ld)x.plan.cost / (ld)first.plan.cost - 1),
              trial % 2 ? 0 : PICK(1e-6L, 1e-14L));
        for (i = 0; i < STEPS * motors; i++) {
            const ld d = fabsl((ld)x.torque[i] / (ld)by[i % motors] - (ld)first.torque[i]) / (ld)first.tau[i % motors];
            BOUND(trial % 2 ? "units of two: torque" : "units: torque", d, trial % 2 ? 0 : PICK(1e-5L, 1e-13L));
        }
    }
}

/* ---- a tick of it ----------------------------------------------------------------------------- */

static void test_follow(int k)
{
    static task x;
    const int n = n_OF(k), n2 = 2 * n, motors = models[k]->motors;
    uint64_t s = 80 + (uint64_t)k;
    roln_real at[2 * MAXN], u[MAXM], off[2 * MAXN];
    plan_at pl;
    instance m;
    int i, j, l;
    place(k, &s, &x);
    pl = planned(&x), m = model_of(&x);
    fill(MAXM, 7, u);
    CHECK(m.of->plan_follow(&m, &x.goal, &pl, 0, x.s, u) == ROLN_E_LENGTH && all(MAXM, u, 7));
    dyadic(STEPS * motors * n2, ROLN_C(0.0625), &s, x.K), dyadic(STEPS * motors, ROLN_C(0.25), &s, x.torque);
    dyadic(n2, ROLN_C(0.0625), &s, off);
    x.plan.valid = 1;
    for (l = 0; l <= STEPS; l++) /* constant acceleration, which Hermite polynomials know */
        for (i = 0; i < n; i++) {
            const roln_real t = (roln_real)l * dt, a = (roln_real)(i + 1) / 4, v = ROLN_C(0.5) - a;
            x.path[l * n2 + i] = ROLN_C(0.25) + v * t + a * t * t / 2, x.path[l * n2 + n + i] = v + a * t;
        }
    for (l = 0; l < 4 * STEPS; l++)
        for (x.plan.age = 0; x.plan.age < 2; x.plan.age++) {
            const roln_real after = (roln_real)l * dt / 4, t = after + (roln_real)x.plan.age * dt;
            const int step = l / 4 + x.plan.age;
            for (i = 0; i < n; i++) {
                const roln_real a = (roln_real)(i + 1) / 4, v = ROLN_C(0.5) - a;
                at[i] = ROLN_C(0.25) + v * t + a * t * t / 2 + off[i], at[n + i] = v + a * t + off[n + i];
            }
            fill(MAXM, 7, u);
            if (step >= STEPS) {
                CHECK(m.of->plan_follow(&m, &x.goal, &pl, after, at, u) == ROLN_E_LENGTH && all(MAXM, u, 7));
                continue;
            }
            if (models[k]->md->lnn.angles & 1) at[0] += ROLN_C(6.283185307179586); /* on another turn */
            CHECK_OK(m.of->plan_follow(&m, &x.goal, &pl, after, at, u));
            for (j = 0; j < motors; j++) {
                ld want = (ld)x.torque[step * motors + j];
                for (i = 0; i < n2; i++)
                    want -= (ld)x.K[(step * motors + j) * n2 + i] * (ld)off[i];
                want = want > (ld)x.tau[j] ? (ld)x.tau[j] : want < -(ld)x.tau[j] ? -(ld)x.tau[j] : want;
                BOUND("torque of a tick", fabsl((ld)u[j] - want), 30 * EPS);
            }
        }
    x.plan.age = 0;
    fill(MAXM, 7, u);
    CHECK(m.of->plan_follow(&m, &x.goal, &pl, -dt, at, u) == ROLN_E_LENGTH && all(MAXM, u, 7));
    CHECK(m.of->plan_follow(&m, &x.goal, &pl, (roln_real)NAN, at, u) == ROLN_E_LENGTH && all(MAXM, u, 7));
    at[n] = (roln_real)NAN;
    CHECK(m.of->plan_follow(&m, &x.goal, &pl, 0, at, u) == ROLN_E_NOT_FINITE && all(MAXM, u, 7));
    fill(STEPS * motors * n2, ROLN_C(1e6), x.K), at[n] = 1;
    CHECK_OK(m.of->plan_follow(&m, &x.goal, &pl, 0, at, u));
    for (j = 0; j < motors; j++)
        CHECK(ROLN_ABS(u[j]) <= x.tau[j]);
}

/* The plan as others' solvers take it: A_k s_k + B_k u_k + c_k is s_k+1, and A, B are the derivatives. */
static void test_linear(int k)
{
    static task x;
    static roln_real A[STEPS * 4 * MAXN * MAXN], B[STEPS * 2 * MAXN * MAXM], c[STEPS * 2 * MAXN];
    const int n2 = 2 * n_OF(k), motors = models[k]->motors;
    uint64_t s = 100 + (uint64_t)k;
    plan_at pl;
    instance m;
    int l, i, j;
    place(k, &s, &x);
    pl = planned(&x), m = model_of(&x);
    CHECK(m.of->plan_linear(&m, &x.goal, &pl, A, B, c, ROOM(plan_linear)) == ROLN_E_LENGTH);
    if (!CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare))) return;
    CHECK_OK(m.of->plan_linear(&m, &x.goal, &pl, A, B, c, ROOM(plan_linear)));
    CHECK_ROOM();
    for (l = 0; l < STEPS; l++) {
        const roln_real h = PICK(ROLN_C(0.03125), ROLN_C(0.0009765625));
        roln_real at[4][2 * MAXN], u[4][MAXM];
        for (i = 0; i < n2; i++) {
            ld sum = (ld)c[l * n2 + i], size = fabsl(sum);
            for (j = 0; j < n2; j++)
                sum += (ld)A[(l * n2 + i) * n2 + j] * (ld)x.path[l * n2 + j], size += fabsl((ld)A[(l * n2 + i) * n2 + j]);
            for (j = 0; j < motors; j++)
                sum += (ld)B[(l * n2 + i) * motors + j] * (ld)x.torque[l * motors + j];
            BOUND("affine", fabsl(sum - (ld)x.path[(l + 1) * n2 + i]) / (1 + size), PICK(1e-5L, 1e-14L));
        }
        for (j = 0; j < n2 + motors; j++) {
            for (i = 0; i < 4; i++) {
                rolni_copy(n2, x.path + l * n2, at[i]), rolni_copy(motors, x.torque + l * motors, u[i]);
                *(j < n2 ? at[i] + j : u[i] + (j - n2)) += (i % 2 ? -h : h) / (roln_real)(1 + i / 2);
                CHECK_OK(step(&x, &m, u[i], at[i]));
            }
            for (i = 0; i < n2; i++) {
                const ld whole = ((ld)at[0][i] - (ld)at[1][i]) / (2 * (ld)h), half = ((ld)at[2][i] - (ld)at[3][i]) / (ld)h;
                const ld d = (4 * half - whole) / 3;
                const ld mine = (ld)(j < n2 ? A[(l * n2 + i) * n2 + j] : B[(l * n2 + i) * motors + j - n2]);
                BOUND("A, B", fabsl(d - mine) / (1 + fabsl(d)), PICK(2e-4L, 1e-9L));
            }
        }
    }
}

/* ---- what is refused -------------------------------------------------------------------------- */

enum { WRONG = 34 };

/* Goal number `what` that makes no sense; its status. */
static roln_status spoil(int what, task *x)
{
    const roln_real nan = (roln_real)NAN;
    roln_real *const of[11] = {x->s, x->weight[0], x->ref[1] + 1, x->C[1], x->u + 1, x->hold, x->P + 1, x->end, &x->goal.dt,
                               &x->term[2].last, x->weight[4] + 1};
    if (what < 11) return *of[what] = what % 2 ? nan : (roln_real)INFINITY, ROLN_E_NOT_FINITE;
    switch (what) {
    case 11: return x->weight[3][0] = -1, ROLN_E_NOT_SPD;
    case 12: return x->u[0] = 0, ROLN_E_NOT_SPD;
    case 13: return x->term[0].last = -1, ROLN_E_NOT_SPD;
    case 14: return x->goal.dt = 0, ROLN_E_RANGE;
    case 15: return x->goal.dt = -1, ROLN_E_RANGE;
    case 16: return x->tau[1] = 0, ROLN_E_RANGE;
    case 17: return x->tau[0] = -1, ROLN_E_RANGE;
    case 18: return x->tau[0] = nan, ROLN_E_RANGE;
    case 19: return x->rate[0] = nan, ROLN_E_RANGE;
    case 20: return x->limits.margin = -1, ROLN_E_RANGE;
    case 21: return x->goal.terms = -1, ROLN_E_LENGTH;
    case 22: return x->goal.iterations = -1, ROLN_E_LENGTH;
    case 23: return x->goal.iterations = ROLN_PLAN_ITERATIONS + 1, ROLN_E_LENGTH;
    case 24: return x->term[1].of = 4, ROLN_E_LENGTH;
    case 25: return x->term[1].of = -1, ROLN_E_LENGTH;
    case 26: return x->term[4].count = -1, ROLN_E_LENGTH;
    case 27: return x->motors.B ? x->motors.count = 1 : 0, x->motors.B ? ROLN_E_LENGTH : ROLN_OK;
    case 29: return x->load[0] = nan, x->goal.load ? ROLN_E_NOT_FINITE : ROLN_OK;
    case 30: return x->goal.end = NULL, ROLN_E_LENGTH;
    case 31: return x->term[0].weight = NULL, ROLN_E_LENGTH;
    case 32: return x->term[0].ref = NULL, ROLN_E_LENGTH;
    case 28: return x->fast[0] = ROLN_C(1e-6), ROLN_E_RANGE; /* wherever it goes, it is out of range */
    default: return x->P[0] = -1, ROLN_E_NOT_SPD;
    }
}

/* A term of nothing, and terms of limits alone, which need no reference. */
static void check_bare_terms(const task *good)
{
    static task x;
    plan_at pl;
    instance m;
    int what, i;
    for (what = 0; what < 3; what++) {
        roln_real low[MAXN], high[MAXN];
        for (i = 0; i < MAXN; i++)
            low[i] = -(roln_real)INFINITY, high[i] = (roln_real)INFINITY;
        x = *good;
        point(&x);
        pl = planned(&x), m = model_of(&x);
        if (what == 0) x.term[4].count = 0, x.term[4].weight = NULL;
        x.term[what == 0 ? 4 : 0].ref = NULL;
        if (what == 1) x.term[0].low = low;
        if (what == 2) x.term[0].high = high;
        CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
    }
}

/* Each leaves the plan what it was, a step older, and at its end there is none. */
static void test_refused(int k)
{
    static task good, x;
    const int motors = models[k]->motors;
    uint64_t s = 120 + (uint64_t)k;
    plan_at pl;
    instance m;
    int what, call;
    place(k, &s, &good);
    good.limits.rate_each = good.rate;
    point(&good);
    pl = planned(&good), m = model_of(&good);
    if (k == PUSHED && m.of->plan_next(&m, &good.goal, good.s, &pl, spare) == ROLN_E_NO_CONVERGENCE)
        return; /* midpoint: too long */
    if (!CHECK_OK(m.of->plan_next(&m, &good.goal, good.s, &pl, spare))) return;
    for (what = 0; what < WRONG; what++) {
        roln_status st, want;
        x = good;
        point(&x);
        pl = planned(&x), m = model_of(&x);
        want = spoil(what, &x);
        if (want == ROLN_OK) continue;
        st = m.of->plan_next(&m, &x.goal, x.s, &pl, spare);
        if (!CHECK(st == want)) printf("    %s, wrong number %d: status %d\n", models[k]->name, what, (int)st);
        CHECK(memcmp(x.path, good.path, sizeof x.path) == 0 && memcmp(x.torque, good.torque, sizeof x.torque) == 0);
        CHECK(memcmp(x.K, good.K, sizeof x.K) == 0 && x.plan.valid == 1 && x.plan.age == 1);
        CHECK(x.plan.cost >= good.plan.cost && x.plan.cost <= good.plan.cost);
        for (call = 1; call < STEPS; call++)
            CHECK(x.plan.valid == 1 && m.of->plan_next(&m, &x.goal, x.s, &pl, spare) == st);
        CHECK(x.plan.valid == 0 && x.plan.age == 0);
    }
    x = good; /* nothing to do */
    point(&x);
    pl = planned(&x), m = model_of(&x);
    x.goal.terms = 0, x.goal.P = NULL, x.goal.hold = NULL, x.plan.valid = 0;
    for (call = 0; call < 3; call++) {
        CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
        for (what = 0; what < STEPS * motors; what++)
            CHECK_NEAR(x.torque[what], 0, 1e-3 * (double)x.tau[what % motors]);
    }
    check_bare_terms(&good);
    x = good; /* after a failure it goes on */
    point(&x);
    pl = planned(&x), m = model_of(&x);
    x.s[0] = (roln_real)NAN;
    CHECK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare) == ROLN_E_NOT_FINITE && x.plan.age == 1);
    x.s[0] = good.s[0];
    CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
    CHECK(x.plan.valid == 1 && x.plan.age == 0);
}

/* Bits of a plan that a fault has flipped, an age out of it and a torque that is no number: there is no plan. */
static void test_damaged(int k)
{
    static const int age[4] = {-1, INT_MIN, INT_MAX, STEPS};
    static task good, x;
    const int motors = models[k]->motors;
    uint64_t s = 130 + (uint64_t)k;
    plan_at pl;
    instance m;
    int i;
    place(k, &s, &good);
    good.goal.terms = 0, good.goal.P = NULL, good.limits.rate_each = good.rate;
    point(&good);
    pl = planned(&good), m = model_of(&good);
    CHECK_OK(m.of->plan_next(&m, &good.goal, good.s, &pl, spare));
    for (i = 0; i < 5; i++) {
        x = good;
        point(&x);
        pl = planned(&x), m = model_of(&x);
        if (i < 4) x.plan.age = age[i];
        else x.torque[motors - 1] = (roln_real)NAN;
        x.goal.dt = -1;
        CHECK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare) == ROLN_E_RANGE && x.plan.valid == 0 && x.plan.age == 0);
        x.goal.dt = dt, x.plan.valid = 1;
        if (i < 4) x.plan.age = age[i];
        CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
        CHECK(x.plan.valid == 1 && x.plan.age == 0 && roln_all_finite(STEPS * motors, x.torque));
    }
}

/* Limits fall below the torque of the last plan: the next one sets out from the limit, and falls at the rate that is allowed. */
static void test_fallen(int k)
{
    static task x;
    const int motors = models[k]->motors;
    uint64_t s = 140 + (uint64_t)k;
    plan_at pl;
    instance m;
    int j;
    place(k, &s, &x);
    pl = planned(&x), m = model_of(&x);
    x.goal.terms = 0, x.goal.P = NULL, x.limits.rate_each = x.rate;
    for (j = 0; j < motors; j++)
        x.hold[j] = ROLN_C(0.875) * x.tau[j], x.rate[j] = x.tau[j] / 8 / dt;
    CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
    for (j = 0; j < motors; j++) {
        CHECK_NEAR(x.torque[j], x.hold[j], 0.01);
        x.hold[j] = 0, x.tau[j] /= 4;
    }
    CHECK_OK(m.of->plan_next(&m, &x.goal, x.s, &pl, spare));
    for (j = 0; j < motors; j++) {
        CHECK_NEAR(x.torque[j] / x.tau[j], 0.5, 0.02);
        CHECK_NEAR(x.torque[motors + j] / x.tau[j], 0, 0.02);
    }
}

/* The range shrinks, that of angles if arcs, so that the last plan leaves it: the next one stays inside. Returns whether there was
   one. */
static int turned_back(int k, int arcs, uint64_t *s)
{
    static task x;
    const int n = n_OF(k), n2 = 2 * n;
    plan_at pl;
    instance m;
    roln_status st;
    int i, l;
    place(k, s, &x);
    pl = planned(&x), m = model_of(&x);
    x.goal.P = NULL, x.goal.hold = NULL, x.goal.load = NULL, x.goal.terms = 1, x.term[0] = x.term[2], x.term[0].last = 0;
    fill(MAXM, ROLN_C(0.0009765625), x.u), fill(MAXN, 1, x.weight[0]), x.limits.margin = 0;
    x.term[0].weight = x.weight[0], x.term[0].ref = x.ref[0];
    for (i = 0; i < n; i++)
        x.ref[0][i] = x.s[i] + (i % 2 ? -1 : 1), x.s[n + i] = 0;
    if (m.of->plan_next(&m, &x.goal, x.s, &pl, spare) != ROLN_OK) return 0;
    for (i = 0; i < n; i++) {
        const roln_real way = x.path[STEPS * n2 + i] - x.s[i];
        x.ref[0][i] = x.s[i];
        if (!arcs && roln_lnn_angle(&models[k]->md->lnn, i)) continue;
        x.low[i] = x.s[i] - ROLN_ABS(way) / 4, x.high[i] = x.s[i] + ROLN_ABS(way) / 4;
    }
    st = m.of->plan_next(&m, &x.goal, x.s, &pl, spare);
    for (l = 0; l <= STEPS && st == ROLN_OK; l++)
        CHECK(m.of->in_range(&m, x.path + l * n2, x.path + l * n2 + n));
    return st == ROLN_OK;
}

/* Returns how often an arc turned a plan back. */
static int test_turned_back(int k)
{
    uint64_t s = 145 + (uint64_t)k;
    int t, turned = 0, arcs = 0;
    for (t = 0; t < 10; t++)
        turned += turned_back(k, 0, &s);
    CHECK(turned > 0);
    for (t = 0; t < 10 && models[k]->md->lnn.angles; t++)
        arcs += turned_back(k, 1, &s);
    return arcs;
}

/* Any number in place of any: state, goal, limits, range. A plan that is taken is finite, its torques within the limits; one that
   is refused leaves the last one; and what the motors are given is a number within their limits, or nothing. */
static void test_any(int k)
{
    const roln_real hostile[12] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, 0, -1, ROLN_C(1e-30), ROLN_C(1e30),
                                   ROLN_C(-1e30), ROLN_EPS, ROLN_C(1e-38), ROLN_C(3e38), 1};
    const int motors = models[k]->motors, n2 = 2 * n_OF(k), tries = check_sample ? 60 : 600;
    static task good, x, before;
    uint64_t s = 150 + (uint64_t)k;
    int i, j;
    place(k, &s, &good);
    for (i = 0; i < tries; i++) {
        roln_real *const at[15] = {x.s, x.low, x.high, x.fast, x.B, x.tau, x.rate, x.u, x.hold, x.weight[0], x.ref[0],
                                   x.C[1], x.P, x.end, &x.goal.dt};
        plan_at pl = planned(&x);
        instance m = model_of(&x);
        int call, what;
        x = good;
        if (i % 2) x.limits.rate_each = x.rate;
        point(&x);
        for (call = 0; call < 3; call++) {
            roln_real u[MAXM] = {7, 7, 7, 7, 7};
            int age;
            roln_status st;
            what = (int)(roln_uniform(&s) * 15);
            if (call > 0) at[what][what < 14 ? i % 2 : 0] = hostile[(int)(roln_uniform(&s) * 12)];
            before = x, age = before.plan.age + 1;
            st = m.of->plan_next(&m, &x.goal, x.s, &pl, spare);
            if (st == ROLN_OK) {
                CHECK(roln_all_finite((STEPS + 1) * n2, x.path) && roln_all_finite(STEPS * motors * n2, x.K));
                CHECK(x.plan.valid == 1 && x.plan.age == 0 && roln_finite(x.plan.cost) && roln_finite(x.plan.duality_gap));
                for (j = 0; j < STEPS * motors; j++)
                    CHECK(ROLN_ABS(x.torque[j]) <= x.tau[j % motors]);
            } else {
                CHECK(memcmp(x.path, before.path, sizeof x.path) == 0 && memcmp(x.K, before.K, sizeof x.K) == 0);
                CHECK(memcmp(x.torque, before.torque, sizeof x.torque) == 0);
                CHECK(x.plan.valid == (before.plan.valid && age < STEPS) && x.plan.age == (x.plan.valid ? age : 0));
            }
            st = m.of->plan_follow(&m, &x.goal, &pl, x.goal.dt / 2, x.s, u);
            for (j = 0; j < motors; j++)
                CHECK(st == ROLN_OK ? ROLN_ABS(u[j]) <= x.tau[j] : u[j] == 7);
        }
    }
}

/* ---- a load ----------------------------------------------------------------------------------- */

/* A machine that is model k with a constant load, of which a filter sees the joints, and plans of that in the loop: the mean
   distance of z from where it shall rest, over the last calls. counted: plans, and what is to hold it, know of the load that the
   filter estimates. */
static ld rest_of(int k, int counted)
{
    enum { CALLS = 400, LAST = 50 };
    static task x;
    static roln_real F[9 * MAXN * MAXN];
    static const roln_real burden[3] = {ROLN_C(0.5), ROLN_C(-0.375), ROLN_C(0.25)};
    const int n = n_OF(k), N = N_OF(k);
    const roln_noise noise = {.dt = dt, .q = ROLN_C(0.0009765625), .tau = ROLN_C(0.0625), .load = ROLN_C(0.25)};
    roln_real z[MAXN], zd[MAXN] = {0}, s[2 * MAXN], load[MAXN], y[MAXN], qd[MAXN], tau[MAXN], still[MAXN] = {0}, tau_z[MAXN];
    roln_real mean[MAXN] = {0}, hold_z[MAXN];
    roln_filter filter = {.valid = 0};
    const filter_at e = {&filter, s, s + n, F, load, NULL};
    uint64_t seed = 140 + (uint64_t)k;
    plan_at pl;
    instance m, estimating;
    int call, i;
    place(k, &seed, &x);
    m = estimating = model_of(&x), pl = planned(&x);
    estimating.of = with_load[k];
    memcpy(z, x.s, sizeof z), memcpy(x.ref[2], z, sizeof z);
    fill(MAXN, 1, x.weight[2]), fill(MAXM, ROLN_C(0.0001220703125), x.u), fill(MAXM, 40, x.tau);
    fill(MAXN, ROLN_C(0.0625), x.weight[3]);
    x.term[0] = x.term[2], x.term[0].moving = 0, x.term[1] = x.term[3], x.term[1].moving = 0, fill(MAXN, 0, x.ref[3]);
    x.goal.terms = 2, x.goal.P = NULL, x.goal.load = counted ? load : NULL;
    CHECK_OK(m.of->inverse(&m, z, still, NULL, still, tau_z, spare)); /* what holds it without a load */
    for (i = 0; i < n; i++) { /* a motor for each coordinate */
        fill(n, 0, hold_z), hold_z[i] = 1;
        CHECK_OK(m.of->lift(&m, z, hold_z, tau, spare));
        for (call = 0; call < N; call++)
            x.B[2 * call + i] = tau[call];
    }
    fill(MAXN, 0, tau), fill(MAXN, 0, load);
    for (call = 0; call < CALLS; call++) {
        CHECK_OK(m.of->decode(&m, z, zd, y, qd, spare));
        CHECK((estimating.of->filter_tick(&estimating, &noise, y, tau, &e, spare) & (ROLN_FAULT_STATUS | ROLN_FILTER_NONE)) == 0);
        for (i = 0; i < n; i++)
            hold_z[i] = tau_z[i] - (counted ? load[i] : 0);
        CHECK_OK(m.of->allocate(&m, x.ref[2], &x.motors, hold_z, x.hold, NULL, spare));
        if (!CHECK_OK(m.of->plan_next(&m, &x.goal, s, &pl, spare))) return 0;
        for (i = 0; i < N; i++)
            tau[i] = x.B[2 * i] * x.torque[0] + x.B[2 * i + 1] * x.torque[1];
        CHECK_OK(m.of->push(&m, z, zd, tau, burden, dt, spare));
        for (i = 0; i < n && call >= CALLS - LAST; i++)
            mean[i] += (z[i] - x.ref[2][i]) / LAST;
    }
    return largest(n, mean);
}

/* Plans that count on the load rest where they shall. */
static void test_load(int k)
{
    ld without, with;
    if (n_OF(k) > 2 || models[k]->md->inputs > 0 || k == DEEP) return; /* two motors hold it; J of size 1e3 */
    without = rest_of(k, 0), with = rest_of(k, 1);
    CHECK(without > 0.002L);
    BOUND("load: offset of plans, a part of that without", with / without, 1e-4L);
}

void TEST_NAME(plan)(void)
{
    int k, held = 0, wrong = 0, arcs = 0;
    for (k = 0; k < MODELS; k++) {
        test_follow(k);
        if (k == DEEP) continue; /* J of size 1e3, with weights of its square: beyond the digits of float, and of differences */
        test_gradient(k);
        test_near(k);
        test_feedback(k);
        held += test_kept(k), wrong += test_kept_wrong(k);
        test_loop(k);
        test_far(k);
        test_motor_units(k);
        test_off(k);
        test_linear(k);
        test_refused(k);
        test_damaged(k);
        test_fallen(k);
        arcs += test_turned_back(k);
        test_any(k);
        test_load(k);
    }
    CHECK(held > MODELS / 2 && wrong > 0 && arcs > 5);
    print_bounds();
}
