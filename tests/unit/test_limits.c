/* SPDX-License-Identifier: MIT */
/* Limits of the guard: what NAME_fit_limits finds in recordings is the least that is silent along them; the residual of energy of
   true motion, under forces that nobody knows, through encoders, its mean over a window, and a limit of it that follows. */

#ifdef ROLN_DOUBLE
/* All of them driven by torques of the joints, with the integrator that errs least. */
#define CALLED(X) X(reduce) X(step)
#define SMALL(name) name##_rk4
#define SMALL_STEP(scheme) rk4
#define SMALL_INPUTS(count) 0
#include "small_models.h"
#endif

#undef CALLED
#define CALLED(X) X(encode) X(decode) X(guard_tick) X(fit_limits)
#include "small.h"
#include "rig.h"

void TEST_NAME(limits)(void);

#ifdef ROLN_DOUBLE
#define RK4_CALLED(name) name##_rk4_called
static const model *const by_rk4[MODELS] = SMALL_TABLE(RK4_CALLED, RK4_CALLED);
#endif

/* The running mean of the residual: R += (r - R) / window, of the residuals r that a guard without a window has; it decides. */
static void test_guard_window(int k)
{
    enum { WINDOW = 5 };
    static rig a, b, both[2];
    const int n = n_OF(k);
    uint64_t s = 350 + (uint64_t)k;
    ld mean = 0, bound = 0;
    int t, found = 0, quiet = 0;
    good(k, &a);
    a.limits.residual = PICK(1e30f, 1e30), a.g.residual = 0, b = a, b.limits.residual_window = WINDOW;
    for (t = 0; t < 60; t++) {
        uint32_t f;
        ld power;
        dyadic(n, ROLN_C(0.5), &s, a.zd);
        memcpy(b.zd, a.zd, sizeof b.zd);
        both[1] = b;
        CHECK(tick(k, &a) == 0 && tick(k, &b) == 0);
        mean += ((ld)a.g.residual - mean) / WINDOW;
        bound = fabsl(mean) > bound ? fabsl(mean) : bound;
        CHECK_NEAR(b.g.residual, mean, 8 * (ld)ROLN_EPS * bound);
        power = fabsl(mean) * (t % 2 ? 1.01L : 0.99L); /* a limit just above it, and just below */
        if (!(power > 1e-3L * bound) || power < 1e-6L) continue;
        both[1].limits.residual = (roln_real)power;
        f = tick(k, both + 1);
        CHECK(f == (t % 2 ? 0 : ROLN_FAULT_ENERGY));
        found += f != 0, quiet += f == 0;
    }
    CHECK(k == BARE || k == SQUARE || (found > 10 && quiet > 10));
    b.g.residual = (roln_real)NAN; /* a damaged one is a fault, and gone */
    CHECK(tick(k, &b) == ROLN_FAULT_ENERGY && roln_finite(b.g.residual) && tick(k, &b) == 0);
}

/* Limits that follow: a guard of its own that gets the residuals by way of its energies. */
typedef struct {
    roln_limits l;
    roln_guard g;
    ld f;    /* the twin: alarms beyond those that were expected, -1 to 16 */
    ld cut;  /* what the bounds of f took from it */
    ld mean; /* of the residuals of this window */
    long alarms, windows, since, row; /* since the last alarm, and alarms in a row up to it */
} followed;

static void follow(followed *x, int window, roln_real a, roln_real limit)
{
    memset(x, 0, sizeof *x);
    x->l.dt = 1, x->l.residual = limit, x->l.residual_window = window, x->l.false_alarms = a;
}

/* A tick whose energy residual is r: the guard, and its twin. Nonzero if the guard speaks. */
static int residual_is(followed *x, roln_real r)
{
    const rolni_balance b = {r, 0};
    const int window = x->l.residual_window > 0 ? x->l.residual_window : 1;
    const ld limit = (ld)x->l.residual * expl(x->f / 8), a = (ld)x->l.false_alarms;
    const int last = x->g.ticks == window - 1;
    const int speaks = rolni_unbalanced(&x->l, &b, 0, &x->g);
    x->mean += (ld)r;
    if (!last) {
        CHECK(!speaks);
        return 0;
    }
    x->mean /= window, x->windows++, x->alarms += speaks;
    CHECK_NEAR(x->g.residual, x->mean, window * (ld)ROLN_EPS * (fabsl(x->mean) + 100));
    if (fabsl(fabsl(x->mean) - limit) > 1e-3L * limit) CHECK(speaks == (fabsl(x->mean) > limit));
    x->f += (speaks ? 1 : 0) - a;
    x->cut += x->f < -1 ? x->f + 1 : x->f > 16 ? x->f - 16 : 0;
    x->f = x->f < -1 ? -1 : x->f > 16 ? 16 : x->f;
    CHECK_NEAR(rolni_raised(&x->l, &x->g, -1), x->f, 1e-3L);
    x->since++;
    if (speaks) x->row = x->since == 1 || 16 * a * (ld)x->since <= 1 ? x->row + 1 : 1, x->since = 0;
    CHECK(x->g.alarms == (uint32_t)x->row && x->g.since == (uint32_t)x->since);
    x->mean = 0;
    return speaks;
}

/* A million windows whose residuals grow by e: the rate of alarms is the one that was asked for, and their number is what the
   recursion says to one. Without following it is not. */
static void test_follow(void)
{
    static const roln_real rate[2] = {ROLN_C(0.01), ROLN_C(0.0001)};
    const long windows = check_sample ? 200000 : 1000000;
    int pass;
    for (pass = 0; pass < 2; pass++) {
        static followed x;
        uint64_t s = 77;
        long t, fixed = 0;
        const roln_real limit = pass ? ROLN_C(3.9) : ROLN_C(2.6);
        follow(&x, 1, rate[pass], limit);
        for (t = 0; t < windows; t++) {
            const roln_real drift = roln_exp(ROLN_C(1.0) * (roln_real)t / (roln_real)windows);
            const roln_real r = drift * roln_normal(&s);
            (void)residual_is(&x, r);
            fixed += ROLN_ABS(r) > limit;
        }
        CHECK((ld)x.alarms < (ld)windows * (ld)rate[pass] + 17);
        CHECK(fabsl((ld)x.alarms - (ld)windows * (ld)rate[pass] - x.f - x.cut) < 0.5L + 1e-2L * (ld)x.alarms);
        if (!check_sample || pass == 0) {
            const ld wanted = (ld)windows * (ld)rate[pass];
            BOUND("guard, rate of alarms over a million windows that drift", fabsl((ld)x.alarms / wanted - 1), 0.2);
            CHECK((ld)fixed > 2 * wanted);
        }
    }
}

/* A machine that rests, or moves slowly, and then moves as ever: its guard says what one says that has just started, but for one or
   two alarms more. */
static void test_follow_rest(void)
{
    static const int quiet[3] = {10, 1000, 100000};
    int i, t;
    for (i = 0; i < 3; i++) {
        followed rested, fresh;
        long before, most;
        uint64_t s = 80;
        follow(&rested, 1, ROLN_C(0.01), ROLN_C(2.6));
        follow(&fresh, 1, ROLN_C(0.01), ROLN_C(2.6));
        for (t = 0; t < 50; t++) /* a load that went, which raises the limit */
            (void)residual_is(&rested, t < 5 ? 100 : 0);
        for (t = 0; t < quiet[i]; t++)
            (void)residual_is(&rested, t % 2 ? 0 : ROLN_C(0.2) * roln_normal(&s));
        before = rested.alarms, most = 0;
        for (t = 0; t < 3000; t++) {
            const roln_real r = roln_normal(&s);
            most = residual_is(&rested, r) && rested.row > most ? rested.row : most;
            (void)residual_is(&fresh, r);
        }
        CHECK(most <= 4 && fresh.alarms > 10 && fabs((double)(rested.alarms - before - fresh.alarms)) <= (i == 0 ? 6 : 2));
    }
}

/* Bounds of the limit, windows of several ticks, damaged guards. */
static void test_follow_edges(void)
{
    const int odd[4] = {0, -1, 0x7fffffff, -0x7fffffff - 1};
    followed x;
    uint64_t s = 78;
    int t, i;
    follow(&x, 5, ROLN_C(0.1), ROLN_C(0.75));
    for (t = 0; t < 5000; t++)
        (void)residual_is(&x, roln_normal(&s));
    CHECK(x.windows == 1000 && x.alarms > 50);
    for (t = 0; t < 500; t++) /* a force that stays: the limit ends at e^2 times what it was */
        (void)residual_is(&x, 1000);
    CHECK_NEAR(rolni_residual_limit(&x.l, &x.g), 0.75L * expl(2), 1e-5L);
    follow(&x, 1, ROLN_C(0.5), 1);
    for (t = 0; t < 3000; t++) /* quiet: it falls by an eighth, which one alarm takes back */
        (void)residual_is(&x, 0);
    CHECK_NEAR(rolni_residual_limit(&x.l, &x.g), expl(-0.125L), 1e-6L);
    CHECK(residual_is(&x, 1));
    CHECK_NEAR(rolni_residual_limit(&x.l, &x.g), expl(-0.0625L), 1e-6L);
    follow(&x, 1, ROLN_C(0.9), 1);
    for (t = 0; t < 3000; t++) /* alarms at the lower bound, and above it */
        (void)residual_is(&x, roln_uniform(&s) < ROLN_C(0.8) ? 0 : 10);
    for (i = 0; i < 4; i++) { /* any bits: a limit of e^(-1/8) to e^2 times the same, and the next windows are counted again */
        rolni_balance b = {2, 0};
        follow(&x, 4, ROLN_C(0.25), 1);
        x.g.ticks = odd[i], x.g.since = x.g.alarms = (uint32_t)odd[i], x.g.sum = (roln_real)NAN;
        x.g.raised = ROLN_C(1e20);
        CHECK(rolni_residual_limit(&x.l, &x.g) <= ROLN_C(7.39));
        x.g.raised = i % 2 ? (roln_real)INFINITY : ROLN_C(-1e9);
        CHECK(rolni_residual_limit(&x.l, &x.g) <= 1);
        for (t = 0; t < 9; t++)
            (void)rolni_unbalanced(&x.l, &b, 0, &x.g);
        CHECK(x.g.ticks >= 0 && x.g.ticks < 4 && roln_finite(x.g.raised));
        CHECK(roln_finite(x.g.residual) && rolni_residual_limit(&x.l, &x.g) <= ROLN_C(7.39));
    }
    for (i = 0; i < 4; i++) {
        const roln_real wrong[4] = {1, -ROLN_C(0.1), (roln_real)NAN, 2};
        follow(&x, 4, wrong[i], 1);
        x.l.tau = 1;
        CHECK(!rolni_limits_valid(&x.l, 1));
    }
    follow(&x, 4, ROLN_C(0.5), 0); /* a rate of nothing that is checked */
    CHECK(!rolni_limits_valid(&x.l, 1));
#ifndef ROLN_DOUBLE /* in double that takes 1e14 ticks */
    follow(&x, 2000000000, ROLN_C(0.01), 1); /* a window counts as one that its sum can hold */
    for (t = 0; t < 2 * (int)(1 / (64 * ROLN_EPS)); t++) {
        rolni_balance b = {ROLN_C(1.5), 0};
        (void)rolni_unbalanced(&x.l, &b, 0, &x.g);
    }
    CHECK(x.g.alarms == 2 && x.g.residual == ROLN_C(1.5));
#endif
}

/* Rounding and overflow: 1 / t of t windows is one of them, k / t of them are k; no residual is as large as infinity. */
static void test_follow_rounding(void)
{
    followed x;
    int t;
    follow(&x, 1, ROLN_C(0.01), sizeof(roln_real) > 4 ? (roln_real)1e308 : (roln_real)1e38); /* a limit that overflows */
    for (t = 0; t < 100; t++) {
        rolni_balance b = {(roln_real)INFINITY, 0};
        CHECK(rolni_unbalanced(&x.l, &b, 0, &x.g));
    }
    for (t = 1; t <= 100000; t++) {
        const int k = t / 3 + 1;
        CHECK(rolni_tail_rank(1 / (roln_real)t, (uint32_t)t - 1) == 1);
        CHECK(rolni_tail_rank((roln_real)k / (roln_real)t, (uint32_t)t - 1) == (uint32_t)k);
        CHECK(rolni_tail_rank(ROLN_C(0.999) / (roln_real)t, (uint32_t)t - 1) == 0);
    }
}

/* Of independent alarms at most one in 16^k is followed by k more in a row, for rates up to 1 / 16. */
static void test_alarms_in_a_row(void)
{
    static const roln_real rate[3] = {ROLN_C(0.001), ROLN_C(0.02), ROLN_C(0.0625)};
    int i;
    for (i = 0; i < 3; i++) {
        const int windows = (int)(4000 / rate[i]);
        uint64_t s = 79;
        long first = 0, second = 0, third = 0;
        followed x;
        int t;
        follow(&x, 1, rate[i], 1);
        for (t = 0; t < windows; t++) {
            const rolni_balance b = {roln_uniform(&s) < rate[i] ? ROLN_C(1e3) : 0, 0};
            if (!rolni_unbalanced(&x.l, &b, 0, &x.g)) continue;
            first++, second += x.g.alarms == 2, third += x.g.alarms == 3;
        }
        CHECK(first > 3000 && second > 0 && (ld)second < 1.2L * (ld)first / 16 && (ld)third < 2 * (ld)first / 256);
    }
}

/* residual_window becomes smaller while a window runs: this one ends at once, with the mean of all of its ticks. */
static void test_follow_shorter(void)
{
    followed x;
    int t;
    follow(&x, 100, ROLN_C(0.01), 1);
    for (t = 0; t < 100; t++) {
        const rolni_balance b = {ROLN_C(0.5), 0};
        if (t == 50) x.l.residual_window = 10;
        CHECK(!rolni_unbalanced(&x.l, &b, 0, &x.g));
    }
    CHECK_NEAR(x.g.residual, 0.5, 0);
    CHECK(x.g.since == 5);
}

/* A guard with false_alarms: a window beyond the limit is a bad tick, and hold + 1 of them in a row stop the motors. */
static void test_alarm_expires(int k)
{
    enum { WINDOW = 3, HOLD = 2 };
    static rig x;
    const int n = n_OF(k);
    int t;
    good(k, &x);
    memset(&x.g, 0, sizeof x.g);
    x.limits.residual = ROLN_C(1e-4), x.limits.false_alarms = ROLN_C(0.01), x.limits.residual_window = WINDOW, x.limits.hold = HOLD;
    for (t = 0; t < 1 + WINDOW * (HOLD + 1); t++) {
        const int alarm = t > 0 && t % WINDOW == 0;
        uint32_t f;
        fill(n, (roln_real)t / 32, x.zd); /* energy from nowhere */
        f = tick(k, &x);
        CHECK((f & ~ROLN_FAULT_EXPIRED) == (alarm ? ROLN_FAULT_ENERGY : 0));
        CHECK(x.g.bad == (t == WINDOW * (HOLD + 1) ? -1 : alarm) && x.g.alarms == (uint32_t)(t / WINDOW));
    }
    CHECK(x.g.bad == -1 && (x.g.faults & ROLN_FAULT_EXPIRED));
}

/* Bad ticks of another kind are in a row only if they follow each other, whatever alarms there were or were not; and ticks whose
   residual is not known are left out of a window, which ends all the same. */
static void test_alarm_among_bad_ticks(int k)
{
    enum { WINDOW = 10, HOLD = 2, TICKS_OF = 400, EVERY = 4 };
    static rig x;
    const int n = n_OF(k);
    int t, pass;
    for (pass = 0; pass < 3; pass++) { /* quiet; quiet, behind an alarm; energy from nowhere */
        int ended = 0;
        good(k, &x);
        memset(&x.g, 0, sizeof x.g);
        x.limits.residual = pass == 2 ? ROLN_C(1e-4) : ROLN_C(1e6);
        x.limits.false_alarms = ROLN_C(0.001), x.limits.residual_window = WINDOW, x.limits.hold = HOLD;
        if (pass == 1) x.g.alarms = 1;
        for (t = 0; t < TICKS_OF && !ended; t++) {
            const roln_real q = x.q[0];
            if (pass == 2) fill(n, (roln_real)t / 32, x.zd);
            if (t % EVERY == 0) x.q[0] = (roln_real)NAN;
            ended = (tick(k, &x) & ROLN_FAULT_EXPIRED) != 0;
            x.q[0] = q;
        }
        CHECK(ended == (pass == 2)); /* of four ticks two have a residual: three windows take 60 ticks */
        CHECK(pass == 2 ? t > 2 * WINDOW * (HOLD + 1) - EVERY && t < 2 * WINDOW * (HOLD + 1) + 2 * EVERY : t == TICKS_OF);
    }
}

/* ---- limits from recordings ------------------------------------------------------------------- */

enum { TICKS = 12, RUNS = 2 };

/* Two recordings of any motion near the manifold. */
typedef struct {
    roln_real q[RUNS * TICKS * MAXN], qd[RUNS * TICKS * MAXN], tau[RUNS * TICKS * MAXN];
} recordings;

static void record(int k, recordings *r)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    uint64_t s = 360 + (uint64_t)k;
    roln_real z[MAXN], zd[MAXN], off[2 * MAXN];
    int t, i;
    for (t = 0; t < RUNS * TICKS; t++) {
        dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.25), &s, zd), dyadic(2 * N, ROLN_C(0.015625), &s, off);
        CHECK_OK(m.of->decode(&m, z, zd, r->q + t * N, r->qd + t * N, spare));
        for (i = 0; i < N; i++)
            r->q[t * N + i] += off[i], r->qd[t * N + i] += off[N + i];
    }
    dyadic(RUNS * TICKS * F_OF(k), 1, &s, r->tau);
    for (i = 0; i < RUNS * TICKS * F_OF(k); i++) /* the first torque is no change */
        r->tau[i] += 3;
}

/* All faults of a guard along the recordings. */
static uint32_t faults_along(int k, const recordings *r, const rig *start, const roln_limits *limits)
{
    const int N = N_OF(k), F = F_OF(k);
    static rig x;
    uint32_t f = 0;
    int t;
    for (t = 0; t < RUNS * TICKS; t++) {
        const instance m = of_rig(k, start);
        if (t % TICKS == 0) {
            x = *start, x.limits = *limits, x.limits.hold = 2000000000;
            memcpy(x.held, r->tau + t * F, sizeof *x.held * (size_t)F);
        }
        memcpy(x.q, r->q + t * N, sizeof *x.q * (size_t)N), memcpy(x.qd, r->qd + t * N, sizeof *x.qd * (size_t)N);
        memcpy(x.want, r->tau + t * F, sizeof *x.want * (size_t)F);
        CHECK_OK(m.of->encode(&m, x.q, x.qd, x.z, x.zd, spare));
        f |= tick(k, &x);
        memcpy(x.held, x.want, sizeof x.held);
    }
    return f;
}

/* Silent along what they were made of, and not with two per cent less of any. */
static void check_least(int k, const recordings *r, const rig *start, const roln_limits *l)
{
    const roln_real less = ROLN_C(0.98);
    roln_real each[MAXN], rates[MAXN];
    roln_limits low;
    int i, what;
    CHECK(faults_along(k, r, start, l) == 0);
    for (what = 0; what < 4; what++) {
        const uint32_t want[4] = {ROLN_FAULT_RANGE, ROLN_FAULT_ENERGY, ROLN_FAULT_MANIFOLD, ROLN_FAULT_MANIFOLD};
        roln_real *const field[4] = {&low.margin, &low.residual, &low.q_tolerance, &low.qd_tolerance};
        low = *l;
        if (!(*field[what] > ROLN_C(1e-4))) continue; /* nothing there: no autoencoder */
        *field[what] *= less;
        if (want[what] != ROLN_FAULT_ENERGY) low.residual = 0; /* after a bad tick it is of the torque that was held */
        CHECK(faults_along(k, r, start, &low) == want[what]);
    }
    for (i = 0; i < F_OF(k); i++)
        for (what = 0; what < 2; what++) {
            memcpy(each, l->tau_each, sizeof each), memcpy(rates, l->rate_each, sizeof rates);
            low = *l, low.tau_each = each, low.rate_each = rates, low.residual = 0;
            (what ? each : rates)[i] *= less;
            CHECK(faults_along(k, r, start, &low) == ROLN_FAULT_LIMIT);
            low.strict = 0;
            CHECK(faults_along(k, r, start, &low) == ROLN_CLIPPED);
        }
}

/* What NAME_fit_limits refuses; nothing is written. */
static void check_fit_refused(int k, const recordings *r, rig *start, const roln_batch *good_batch, const roln_limits *from)
{
    static recordings bad;
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    const instance m = of_rig(k, start);
    roln_batch wrong[5], b = *good_batch;
    roln_real each[MAXN], rates[MAXN], B[MAXN] = {1};
    const roln_motors one = {.count = 1, .B = B};
    roln_limits l = *from;
    int i, t;
    fill(MAXN, 7, each), fill(MAXN, 7, rates);
#define REFUSED(batch, slack, status) \
    CHECK(m.of->fit_limits(&m, batch, slack, &l, each, rates, ROOM(fit_limits)) == (status) && all(MAXN, each, 7) && \
          all(MAXN, rates, 7))
    for (i = 0; i < 5; i++)
        wrong[i] = b;
    wrong[0].count = 0, wrong[1].steps = -1, wrong[2].stride = 2, wrong[3].qd = NULL, wrong[4].steps = 0;
    for (i = 0; i < 5; i++)
        REFUSED(wrong + i, 1, ROLN_E_LENGTH);
    REFUSED(&b, ROLN_C(0.99), ROLN_E_RANGE);
    REFUSED(&b, (roln_real)NAN, ROLN_E_RANGE);
    REFUSED(&b, (roln_real)INFINITY, ROLN_E_NOT_FINITE); /* limits that are none */
    b.tau = NULL;
    REFUSED(&b, (roln_real)INFINITY, ROLN_E_NOT_FINITE);
    b.tau = good_batch->tau;
    for (i = 0; i < 3; i++) {
        bad = *r;
        (i == 0 ? bad.q : i == 1 ? bad.qd : bad.tau)[RUNS * TICKS * (i < 2 ? N : F) - 1] = (roln_real)NAN; /* the last number */
        b.q = bad.q, b.qd = bad.qd, b.tau = bad.tau;
        REFUSED(&b, 1, ROLN_E_NOT_FINITE);
    }
    for (i = 0, bad = *r; i < F; i++) { /* a torque that never changes has no limit of its rate; one that is 0 needs none */
        for (t = 0; t < RUNS * TICKS; t++)
            bad.tau[t * F + i] = 3;
        b.q = bad.q, b.qd = bad.qd, b.tau = bad.tau;
        REFUSED(&b, 1, ROLN_E_RANGE);
        for (t = 0; t < RUNS * TICKS; t++)
            bad.tau[t * F + i] = 0;
    }
    CHECK_OK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    CHECK(all(F, each, 0) && all(F, rates, 0));
    fill(MAXN, 7, each), fill(MAXN, 7, rates), l = *from;
    b = *good_batch;
    fill(n, 0, start->z_min), fill(n, 0, start->z_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    fill(n, -99, start->z_min), fill(n, 99, start->z_max), fill(n, 0, start->zd_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    CHECK(memcmp(&l, from, sizeof l) == 0);
    l.dt = 0;
    REFUSED(&b, 1, ROLN_E_RANGE);
    l.dt = from->dt, l.residual_window = -1;
    REFUSED(&b, 1, ROLN_E_RANGE);
    l = *from, l.tau = 0, b.tau = NULL; /* torques that nobody has told of */
    fill(n, 99, start->zd_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    if (m.of->md->inputs > 0) return;
    b.tau = good_batch->tau, l.motors = &one;
    REFUSED(&b, 1, ROLN_E_RANGE);
#undef REFUSED
}

/* With slack = 1 the margin holds the recordings that it is of, however it rounds. */
static void check_fit_margin(int k, const recordings *r, rig *start, const roln_batch *b, const roln_limits *from)
{
    const instance m = of_rig(k, start);
    roln_real each[MAXN], rates[MAXN];
    uint64_t seed = 77;
    int i;
    for (i = 0; i < 100; i++) {
        roln_limits l = *from;
        fill(n_OF(k), ROLN_C(0.03) + ROLN_C(0.1) * roln_uniform(&seed), start->zd_max);
        CHECK_OK(m.of->fit_limits(&m, b, 1, &l, each, rates, ROOM(fit_limits)));
        CHECK((faults_along(k, r, start, &l) & ROLN_FAULT_RANGE) == 0);
    }
    fill(n_OF(k), 99, start->zd_max);
}

/* What rests needs no range of velocities. Where all rests there is no range. */
static void check_fit_rest(int k, rig *start, const roln_batch *good_batch, const roln_limits *from)
{
    static roln_real rest[RUNS * TICKS * MAXN];
    const instance m = of_rig(k, start);
    roln_batch b = *good_batch;
    roln_real each[MAXN], rates[MAXN];
    roln_limits l = *from;
    fill(n_OF(k), 0, start->zd_max), b.qd = rest;
    CHECK_OK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    fill(n_OF(k), 0, start->z_min), fill(n_OF(k), 0, start->z_max), b.q = rest;
    CHECK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)) == ROLN_E_RANGE);
    fill(n_OF(k), -99, start->z_min), fill(n_OF(k), 99, start->z_max), fill(n_OF(k), 99, start->zd_max);
}

/* With false_alarms a recording holds a window; nothing that moves has no residual, and no rate of it. */
static void check_fit_alarms(int k, const rig *start, const roln_batch *good_batch, const roln_limits *from)
{
    static roln_real rest[RUNS * TICKS * MAXN];
    const instance m = of_rig(k, start);
    roln_batch b = *good_batch;
    roln_real each[MAXN], rates[MAXN];
    roln_limits l = *from;
    l.tau = 1, l.false_alarms = 1;
    CHECK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)) == ROLN_E_RANGE);
    l.false_alarms = ROLN_C(0.01), l.residual_window = TICKS;
    CHECK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)) == ROLN_E_LENGTH);
    l.residual_window = TICKS - 1; /* two windows: one in three is one of them, one in four is none */
    CHECK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)) == ROLN_E_LENGTH);
    l.false_alarms = ROLN_C(0.25);
    CHECK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)) == ROLN_E_LENGTH);
    l.false_alarms = ROLN_C(0.34);
    CHECK_OK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    l = *from, l.false_alarms = ROLN_C(0.25), l.tau = 1, b.q = b.qd = rest, b.tau = NULL;
    CHECK_OK(m.of->fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    CHECK(l.residual <= 0 && l.false_alarms <= 0 && rolni_limits_valid(&l, 0));
}

/* With false_alarms the residual is that of the window whose rank is a (W + 1) from above, by sorting them. */
static void check_fit_tail(int k, const recordings *r, const rig *start, const roln_batch *b, const roln_limits *from)
{
    enum { WINDOW = 2, WINDOWS = RUNS * ((TICKS - 1) / WINDOW) };
    static rig x;
    const instance m = of_rig(k, start);
    const int N = N_OF(k), F = F_OF(k);
    roln_real each[MAXN], rates[MAXN], found[WINDOWS];
    roln_limits l = *from;
    int t, i, rank, count = 0;
    for (t = 0; t < RUNS * TICKS; t++) { /* largest first */
        if (t % TICKS == 0) {
            x = *start, memset(&x.g, 0, sizeof x.g);
            x.limits = *from, x.limits.tau = x.limits.residual = x.limits.margin = ROLN_C(1e30), x.limits.strict = 0;
            x.limits.residual_window = WINDOW, x.limits.false_alarms = ROLN_C(0.5);
        }
        memcpy(x.q, r->q + t * N, sizeof *x.q * (size_t)N), memcpy(x.qd, r->qd + t * N, sizeof *x.qd * (size_t)N);
        memcpy(x.want, r->tau + t * F, sizeof *x.want * (size_t)F);
        CHECK_OK(m.of->encode(&m, x.q, x.qd, x.z, x.zd, spare));
        CHECK(tick(k, &x) == 0);
        if (t % TICKS == 0 || x.g.ticks > 0) continue;
        for (i = count++; i > 0 && found[i - 1] < ROLN_ABS(x.g.residual); i--)
            found[i] = found[i - 1];
        found[i] = ROLN_ABS(x.g.residual);
    }
    CHECK(count == WINDOWS);
    l.residual_window = WINDOW;
    for (rank = 1; rank <= WINDOWS; rank++) { /* the last: as close to 1 as a number can be, which asks for more windows */
        l.false_alarms = rank < WINDOWS ? (roln_real)(rank + 0.5) / (WINDOWS + 1) : 1 - ROLN_EPS / 2;
        CHECK_OK(m.of->fit_limits(&m, b, 3, &l, each, rates, ROOM(fit_limits)));
        ROOM_KEPT();
        CHECK_NEAR(l.residual, (ld)found[rank - 1], (ld)found[0] * (1 / 16384.L + 16 * (ld)ROLN_EPS));
        CHECK(l.residual >= found[rank - 1]);
    }
}

static void test_fit_limits(int k)
{
    static recordings r;
    static rig start;
    const int n = n_OF(k), F = F_OF(k);
    const roln_real slack = 1 + 64 * ROLN_EPS, safe[MAXN] = {0};
    const roln_batch b = {RUNS, TICKS - 1, 1, NULL, r.q, r.qd, NULL, r.tau};
    roln_batch free_motion = b;
    roln_real each[MAXN], rates[MAXN], twice[MAXN], fast[MAXN];
    roln_limits l, l2, was;
    instance m;
    int i;
    good(k, &start);
    record(k, &r);
    fill(n, ROLN_C(-0.25), start.z_min), fill(n, ROLN_C(0.25), start.z_max), fill(n, ROLN_C(0.25), start.zd_max);
    m = of_rig(k, &start);
    memset(&start.g, 0, sizeof start.g);
    memset(&l, 0, sizeof l);
    l.dt = ROLN_C(0.0625), l.residual_window = 3, l.hold = 7, l.strict = 1, l.safe = safe, l.tau = 99, was = l;
    fill(MAXN, 7, each), fill(MAXN, 7, rates);
    CHECK_OK(m.of->fit_limits(&m, &b, slack, &l, each, rates, ROOM(fit_limits)));
    ROOM_KEPT();
    CHECK(l.hold == 7 && l.residual_window == 3 && l.strict == 1 && l.safe == safe && l.tau_each == each && l.rate_each == rates);
    CHECK(all(MAXN - F, each + F, 7) && all(MAXN - F, rates + F, 7));
    CHECK(largest(F, each) <= (ld)l.tau && largest(F, rates) <= (ld)l.rate && l.margin > ROLN_C(0.1));
    check_least(k, &r, &start, &l);
    fill(n, -99, start.z_min), fill(n, 99, start.z_max), fill(n, ROLN_C(0.0625), start.zd_max); /* velocities alone are beyond */
    l2 = was;
    CHECK_OK(m.of->fit_limits(&m, &b, slack, &l2, twice, fast, ROOM(fit_limits)));
    CHECK(l2.margin > 1);
    check_least(k, &r, &start, &l2);
    fill(n, ROLN_C(-0.25), start.z_min), fill(n, ROLN_C(0.25), start.z_max), fill(n, ROLN_C(0.25), start.zd_max);
    l2 = was; /* slack is a factor of all */
    CHECK_OK(m.of->fit_limits(&m, &b, 2 * slack, &l2, twice, fast, ROOM(fit_limits)));
    CHECK(all(1, &l2.residual, 2 * l.residual) && all(1, &l2.margin, 2 * l.margin) && all(1, &l2.q_tolerance, 2 * l.q_tolerance));
    CHECK(all(1, &l2.qd_tolerance, 2 * l.qd_tolerance) && all(1, &l2.tau, 2 * l.tau) && all(1, &l2.rate, 2 * l.rate));
    for (i = 0; i < F; i++)
        CHECK(all(1, twice + i, 2 * each[i]) && all(1, fast + i, 2 * rates[i]));
    /* a range that holds all still gets a tenth; without torques their limits stay */
    fill(n, -99, start.z_min), fill(n, 99, start.z_max), fill(n, 99, start.zd_max);
    free_motion.tau = NULL, l = was, fill(MAXN, 7, each);
    CHECK_OK(m.of->fit_limits(&m, &free_motion, slack, &l, each, rates, ROOM(fit_limits)));
    CHECK(all(1, &l.margin, ROLN_C(0.1)) && all(1, &l.tau, 99) && !l.tau_each && !l.rate_each && all(MAXN, each, 7));
    for (i = 0; i < 4; i++) { /* no limits that the guard refuses */
        const roln_real wrong[4] = {(roln_real)NAN, (roln_real)INFINITY, -1, 2};
        int rate;
        for (rate = 0; rate < 2; rate++) {
            roln_status st;
            l = was, l.tau_each = each, *(rate ? &l.rate : &l.tau) = wrong[i];
            st = m.of->fit_limits(&m, &free_motion, slack, &l, twice, fast, ROOM(fit_limits));
            CHECK(st == (i < 3 ? ROLN_E_RANGE : ROLN_OK) && l.tau_each == each && (i == 3) == (l.margin > 0));
        }
    }
    check_fit_margin(k, &r, &start, &b, &was);
    check_fit_rest(k, &start, &b, &was);
    check_fit_alarms(k, &start, &b, &was);
    check_fit_tail(k, &r, &start, &b, &was);
    check_fit_refused(k, &r, &start, &b, &was);
}

#ifdef ROLN_DOUBLE
/* A motion of the model of half a second, tick by tick. */
typedef struct {
    double h, power; /* time of a tick; largest power of the forces that the guard does not know */
    int ticks;
    double z[300][MAXN], zd[300][MAXN], want[300][MAXN];
} motion;

/* push: a force on the joints that the guard does not know. */
static void move(int k, double h, double push, motion *x)
{
    const instance m = trained(by_rk4[k], scale_of(k), theta_k);
    const int n = n_OF(k), F = F_OF(k), N = N_OF(k), inside = 20, inputs = models[k]->md->inputs;
    double s[2 * MAXN], tau[MAXN], tau_z[MAXN], outside[MAXN];
    uint64_t seed = 320 + (uint64_t)k;
    int t, i, j, p;
    parameters(k, &seed, theta_k);
    dyadic(2 * n, ROLN_C(0.5), &seed, s), dyadic(N, push, &seed, outside);
    x->h = h, x->ticks = (int)(0.5 / h), x->power = 0;
    for (t = 0; t < x->ticks; t++) {
        double power = 0;
        for (i = 0; i < F; i++)
            x->want[t][i] = 0.5 * sin(3 * t * h + i);
        memcpy(x->z[t], s, sizeof *x->z), memcpy(x->zd[t], s + n, sizeof *x->zd);
        for (i = 0; i < N; i++) {
            tau[i] = outside[i] + (inputs ? 0 : x->want[t][i]);
            for (j = 0; j < inputs; j++)
                tau[i] += theta_k[models[k]->params - N * F + i * F + j] * x->want[t][j];
        }
        CHECK_OK(m.of->reduce(&m, x->z[t], outside, tau_z, spare));
        for (i = 0; i < n; i++)
            power += tau_z[i] * x->zd[t][i];
        x->power = fabs(power) > x->power ? fabs(power) : x->power;
        for (p = 0; p < inside; p++)
            CHECK_OK(m.of->step(&m, s, s + n, tau, h / inside, spare));
    }
}

/* Does the energy check of a guard with this limit find anything in a motion? */
static int caught(int k, const motion *mo, double limit)
{
    static rig x;
    const int n = n_OF(k);
    int t;
    memset(&x, 0, sizeof x);
    fill(n, -9, x.z_min), fill(n, 9, x.z_max), fill(n, 99, x.zd_max);
    x.limits.dt = mo->h, x.limits.tau = 9, x.limits.residual = limit, x.limits.hold = 1000;
    for (t = 0; t < mo->ticks; t++) {
        uint32_t f;
        memcpy(x.z, mo->z[t], sizeof x.z), memcpy(x.zd, mo->zd[t], sizeof x.zd), memcpy(x.want, mo->want[t], sizeof x.want);
        f = tick(k, &x);
        CHECK((f & ~(uint32_t)ROLN_FAULT_ENERGY) == 0);
        memcpy(x.held, mo->want[t], sizeof x.held); /* what the motors did: the model's own motion goes on */
        if (f) return 1;
    }
    return 0;
}

/* The smallest limit that passes a motion, by bisection. heavy: the guard's model has M e^heavy. */
static double residual(int k, double h, double push, double heavy, double *power)
{
    static motion mo;
    const roln_lnn *f = &models[k]->md->lnn;
    double lo = 0, hi = 1e4;
    int i, it;
    move(k, h, push, &mo);
    *power = mo.power;
    for (i = 0; i < f->n && fabs(heavy) > 0; i++) /* U + heavy I */
        theta_k[roln_ae_params(&models[k]->md->ae) + roln_mlp_params(&f->mass_net) - ROLN_TRI(f->n) + i] += heavy;
    CHECK(!caught(k, &mo, hi));
    for (it = 0; it < 44; it++) {
        const double mid = sqrt((lo + 1e-14) * hi);
        if (caught(k, &mo, mid)) lo = mid;
        else hi = mid;
    }
    return hi;
}

static void test_guard_energy(int k)
{
    double P, r[3], pushed, light, wrong;
    r[0] = residual(k, 1 / 64., 0, 0, &P);
    r[1] = residual(k, 1 / 128., 0, 0, &P);
    r[2] = residual(k, 1 / 256., 0, 0, &P);
    BOUND("guard, residual of a true motion, dt = 1/64", r[0], 1);
    BOUND("guard, residual, halved dt: 4 times", fabs(log2(r[0] / r[1]) - 2), 0.35);
    BOUND("guard, residual, halved again", fabs(log2(r[1] / r[2]) - 2), 0.35);
    pushed = residual(k, 1 / 256., 1, 0, &P); /* an external force of known power */
    BOUND("guard, power of an unknown force", fabs(pushed / P - 1), 0.08);
    CHECK(pushed > 20 * r[2]);
    light = residual(k, 1 / 256., -0.125, 0, &P);
    BOUND("guard, power of a small one", fabs(light / P - 1), 0.1);
    if (models[k]->formed || models[k]->base) return;
    wrong = residual(k, 1 / 256., 0, 0.4, &P);
    CHECK(wrong > 20 * r[2]);
#ifdef ROLN_TEST_VERBOSE
    printf("guard, model %d: residual %.2e %.2e %.2e W; pushed %.3f W; M off by half: %.3f W\n", k, r[0], r[1], r[2], pushed,
           wrong);
#endif
}

/* The largest residual of a guard that sees a motion through 12-bit encoders. */
static double encoder_residual(int k, double push, int window)
{
    static motion mo;
    static rig x;
    const double angle = 6.283185307179586 / 4096, h = 1 / 256., rate = angle / (8 * h);
    const int n = n_OF(k);
    double top = 0;
    int t, i;
    move(k, h, push, &mo);
    memset(&x, 0, sizeof x);
    fill(n, -99, x.z_min), fill(n, 99, x.z_max), fill(n, 99, x.zd_max);
    x.limits.dt = h, x.limits.tau = 9, x.limits.residual = 1e30, x.limits.residual_window = window;
    for (t = 0; t < mo.ticks; t++) {
        for (i = 0; i < n; i++)
            x.z[i] = angle * floor(mo.z[t][i] / angle + 0.5), x.zd[i] = rate * floor(mo.zd[t][i] / rate + 0.5);
        memcpy(x.want, mo.want[t], sizeof x.want);
        CHECK(tick(k, &x) == 0);
        top = fabs(x.g.residual) > top ? fabs(x.g.residual) : top;
    }
    return top;
}

/* Through encoders the residual of a single tick is mostly that of their steps; the mean over 32 is 25 times less, and a force that
   the model does not know stands out. */
static void test_guard_encoder(int k)
{
    const double push = 8 / scale_of(k)->q; /* as much in the units of the networks */
    const double one = encoder_residual(k, 0, 0), mean = encoder_residual(k, 0, 32), pushed = encoder_residual(k, push, 32);
    BOUND("guard, 12-bit encoders, mean over 32 ticks / one tick", mean / one, 1 / 25.);
    CHECK(pushed > 4 * mean);
#ifdef ROLN_TEST_VERBOSE
    printf("guard, model %d: residual through encoders %.2e, mean of 32 %.2e W; pushed %.3f W\n", k, one, mean, pushed);
#endif
}
#endif

void TEST_NAME(limits)(void)
{
    int k;
    test_follow();
    test_follow_rest();
    test_follow_edges();
    test_follow_rounding();
    test_follow_shorter();
    test_alarms_in_a_row();
    for (k = 0; k < MODELS; k++) {
#ifdef ROLN_DOUBLE
        test_guard_energy(k);
        test_guard_encoder(k);
#endif
        test_guard_window(k);
        test_alarm_expires(k);
        test_alarm_among_bad_ticks(k);
        test_fit_limits(k);
    }
    print_bounds();
}
