/* SPDX-License-Identifier: MIT */
/* Torques that act some ticks after they were sent (ROLN_DELAY): the torques on their way, a state carried ahead, a whole tick, the
   energy residual, limits from recordings, a loop on a machine with a delay. Every small model with a delay of 1 and of 3 ticks,
   beside the one without. */
#define CALLED(X) X(ahead) X(guard_tick) X(tick) X(fit_limits)
#define EVERY_DELAY 1
#define SMALL(name) name##_soon
#include "small_models.h"
#undef EVERY_DELAY
#define EVERY_DELAY 3
#define SMALL(name) name##_late
#include "small_models.h"
#undef EVERY_DELAY
#undef CALLED
#define CALLED(X) \
    X(encode) X(decode) X(step) X(push) X(dynamics) X(control) X(lift) X(allocate) X(guard_tick) X(tick) X(fit_limits)
#include "small.h"
#include "rig.h"

void TEST_NAME(delay)(void);

enum { LONGEST = 3, LATE = 2 };
#define SOON_CALLED(name) name##_soon_called
#define LATE_CALLED(name) name##_late_called
static const model *const delayed[LATE][MODELS] = {SMALL_TABLE(SOON_CALLED, SOON_CALLED), SMALL_TABLE(LATE_CALLED, LATE_CALLED)};

/* Model k with the delay of table `late`, the numbers of x. */
static instance late_of(int k, int late, const rig *x)
{
    const instance m = {delayed[late][k], scale_of(k), x->z_min, x->z_max, x->zd_max, theta_k, NULL};
    return m;
}

static roln_real held[(1 + LONGEST) * MAXN]; /* of a guard with a delay: tau, sent */

/* ---- torques on their way ---------------------------------------------------------------------- */

/* A guard with a delay lets the same torques pass as one without, and remembers those of the last ticks in their order, also
   through bad ticks, after it has expired and when it is armed again. */
static void test_sent(int k, int late)
{
    enum { TICKS = 40 };
    static rig x;
    static roln_real all_sent[TICKS + LONGEST + 1][MAXN];
    const int F = F_OF(k), D = delayed[late][k]->delay;
    uint64_t s = 71;
    roln_guard g;
    const guard_at at = {&g, held};
    int t, i;
    good(k, &x);
    x.limits.residual = 0;
    memset(&x.g, 0, sizeof x.g), memset(&g, 0, sizeof g), fill(MAXN, 0, x.held), fill((1 + LONGEST) * MAXN, 0, held);
    memset(all_sent, 0, sizeof all_sent);
    CHECK(D == (late ? 3 : 1));
    for (t = 0; t < TICKS; t++) {
        const instance m = late_of(k, late, &x);
        uint32_t faults;
        dyadic(F, 1, &s, x.want);
        x.failed = t % 11 > 6 ? CONTROLLER : t % 7 == 3 ? ENCODER : NOTHING; /* expires at the fourth in a row */
        faults = tick(k, &x);
        CHECK(m.of->guard_tick(&m, &x.limits, x.q, x.qd, x.failed == ENCODER ? NULL : x.z, x.failed == ENCODER ? NULL : x.zd,
                               x.failed ? NULL : x.want, &at, room_of(m.of->scratch.guard_tick)) == faults);
        ROOM_KEPT();
        CHECK(same_guard(&g, &x.g) && same(F, held, x.held));
        memcpy(all_sent[t + D + 1], held, (size_t)F * sizeof *held);
        for (i = 0; i < D; i++)
            CHECK(same(F, held + (1 + i) * F, all_sent[t + 1 + i]));
        if (t % 11 == 10) { /* arm */
            CHECK(g.bad == -1);
            memset(&g, 0, sizeof g), memset(&x.g, 0, sizeof x.g);
        }
    }
}

/* ---- a state ahead ---------------------------------------------------------------------------- */

/* Torques on their way, in the order in which they act: those sent before the last one, then this one. */
static const roln_real *coming(int F, int D, int h)
{
    return h + 1 < D ? held + (h + 2) * F : held;
}

/* NAME_ahead is a step of each tick under the torque that acts then, by NAME_step of the model without delay, bit for bit: torques
   of joints, inputs or motors, with a load and without. What fails leaves the state. */
static void test_ahead(int k, int late)
{
    static rig x;
    static roln_real B[2 * MAXN];
    const instance m = late_of(k, late, &x), plain_one = of_rig(k, &x);
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), D = m.of->delay, inputs = m.of->md->inputs;
    const roln_motors motors = {2, B, 0}, wrong = {.count = N + 1, .B = B};
    const guard_at at = {&x.g, held};
    uint64_t s = 72;
    int what;
    good(k, &x);
    for (what = 0; what < 8; what++) {
        const int by_motors = (what & 1) && inputs == 0 && N > 1, pushed = what >> 1 & 1;
        roln_real z[MAXN], zd[MAXN], z_twin[MAXN], zd_twin[MAXN], load[MAXN], tau[MAXN];
        int h, i, j;
        dyadic((1 + LONGEST) * MAXN, 1, &s, held), dyadic(2 * MAXN, 1, &s, B), dyadic(n, 1, &s, load);
        dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.5), &s, zd);
        memcpy(z_twin, z, sizeof z), memcpy(zd_twin, zd, sizeof zd);
        x.limits.motors = by_motors ? &motors : NULL, x.limits.dt = dt / 16;
        CHECK_OK(m.of->ahead(&m, &x.limits, &at, pushed ? load : NULL, z, zd, room_of(m.of->of_ahead)));
        CHECK_ROOM();
        for (h = 0; h < D; h++) {
            const roln_real *u = coming(F, D, h);
            for (i = 0; i < N && by_motors; i++)
                for (tau[i] = 0, j = 0; j < 2; j++)
                    tau[i] += B[2 * i + j] * u[j];
            if (pushed) CHECK_OK(plain_one.of->push(&plain_one, z_twin, zd_twin, by_motors ? tau : u, load, x.limits.dt, spare));
            else CHECK_OK(plain_one.of->step(&plain_one, z_twin, zd_twin, by_motors ? tau : u, x.limits.dt, spare));
        }
        BOUND("ahead: the steps of a twin", fmaxl(furthest(n, z, z_twin), furthest(n, zd, zd_twin)) / ROLN_EPS, by_motors ? 64 : 0);
        /* refusals */
        memcpy(z_twin, z, sizeof z), memcpy(zd_twin, zd, sizeof zd);
        x.limits.motors = &wrong;
        CHECK(m.of->ahead(&m, &x.limits, &at, NULL, z, zd, spare) == ROLN_E_SHAPE);
        x.limits.motors = NULL, x.limits.dt = what & 1 ? (roln_real)NAN : dt;
        if (!(what & 1)) held[D > 1 ? 2 * F : 0] = (roln_real)INFINITY; /* the next that acts */
        CHECK(m.of->ahead(&m, &x.limits, &at, NULL, z, zd, spare) != ROLN_OK);
        CHECK(same(n, z, z_twin) && same(n, zd, zd_twin));
    }
}

/* ---- a whole tick ----------------------------------------------------------------------------- */

/* Nonzero if a state is in range, widened by the margin. */
static int in_box(int k, const rig *x, const roln_real *z, const roln_real *zd)
{
    int i, in = 1;
    for (i = 0; i < n_OF(k); i++) {
        const roln_real wide = x->limits.margin * (x->z_max[i] - x->z_min[i]);
        in &= roln_lnn_angle(&models[k]->md->lnn, i) || (z[i] >= x->z_min[i] - wide && z[i] <= x->z_max[i] + wide);
        in &= ROLN_ABS(zd[i]) <= (1 + x->limits.margin) * x->zd_max[i];
    }
    return in;
}

/* A tick by its parts: the controller at the state ahead, the guard at the measured one. */
static uint32_t by_parts(int k, int late, rig *x, const target_at *ref, const guard_at *at)
{
    const instance m = late_of(k, late, x), base = of_rig(k, x);
    const roln_motors *motors = x->limits.motors;
    const int loaded = m.of->load && ref->load;
    roln_real z[MAXN], zd[MAXN], tau_z[MAXN];
    uint32_t more = 0;
    roln_status st = base.of->encode(&base, x->q, x->qd, x->z, x->zd, spare);
    const int seen = st == ROLN_OK;
    memcpy(z, x->z, sizeof z), memcpy(zd, x->zd, sizeof zd);
    if (st == ROLN_OK) st = m.of->ahead(&m, &x->limits, at, loaded ? ref->load : NULL, z, zd, spare);
    if (st == ROLN_OK && !in_box(k, x, z, zd)) st = ROLN_E_RANGE, more = ROLN_FAULT_RANGE;
    if (st == ROLN_OK) st = base.of->control(&base, z, zd, ref, tau_z, spare);
    if (st == ROLN_OK && !motors && m.of->md->inputs == 0) st = base.of->lift(&base, z, tau_z, x->want, spare);
    else if (st == ROLN_OK) st = base.of->allocate(&base, z, motors, tau_z, x->want, &at->g->allocation_residual, spare);
    at->g->faults |= more;
    return more | m.of->guard_tick(&m, &x->limits, x->q, x->qd, seen ? x->z : NULL, seen ? x->zd : NULL,
                                   st == ROLN_OK ? x->want : NULL, at, spare);
}

/* NAME_tick is its parts, bit for bit, with good and bad numbers, in range and out of it, now and ahead. driven: by two
   motors. */
static void test_tick(int k, int late, int driven)
{
    enum { TICKS = 64 };
    static rig a, b;
    static roln_real held_b[(1 + LONGEST) * MAXN];
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), rows = (1 + LONGEST) * MAXN;
    const guard_at at_a = {&a.g, held}, at_b = {&b.g, held_b};
    roln_real B[2 * MAXN];
    const roln_motors learned = {.mu = ROLN_C(0.25)}, two = {2, B, ROLN_C(0.25)};
    roln_real r[3 * MAXN], gain[2 * MAXN], load[MAXN];
    const target_at ref = {r, r + n, r + 2 * n, gain, gain + n, load};
    uint64_t s = 73;
    int t, i, went = 0, beyond = 0;
    good(k, &a);
    dyadic(2 * MAXN, 1, &s, B);
    if (models[k]->md->inputs > 0) a.limits.motors = &learned;
    else if (driven && N > 1) a.limits.motors = &two;
    fill(rows, 0, held), fill(rows, 0, held_b), fill(MAXN, 0, a.held), memset(&a.g, 0, sizeof a.g);
    a.limits.tau = 1000, a.limits.strict = 0, a.limits.dt = dt / 16, a.limits.q_tolerance = a.limits.qd_tolerance = 100;
    b = a;
    for (t = 0; t < TICKS; t++) {
        const instance m = late_of(k, late, &b);
        uint32_t faults;
        dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd), dyadic(3 * n, 1, &s, r), dyadic(2 * n, 1, &s, gain), dyadic(n, 1, &s, load);
        for (i = 0; i < N; i++)
            a.q[i] /= 16, a.qd[i] /= 64;
        if (t % 8 == 3) a.q[t % N] = (roln_real)NAN;
        if (t % 8 == 5) r[t % (3 * n)] = (roln_real)INFINITY;
        fill(n, -100, a.z_min), fill(n, 100, a.z_max), fill(n, 100, a.zd_max);
        if (t % 4 == 2) { /* a range that the state just does not leave, now */
            const instance base = of_rig(k, &a);
            CHECK_OK(base.of->encode(&base, a.q, a.qd, a.z, a.zd, spare));
            for (i = 0; i < n; i++)
                a.zd_max[i] = ROLN_ABS(a.zd[i]) * ROLN_C(1.0009765625) / (1 + a.limits.margin);
        }
        a.limits.residual = t % 16 == 7 ? ROLN_C(0.0009765625) : 1000;
        if (a.g.bad < 0) memset(&a.g, 0, sizeof a.g);
        memcpy(b.q, a.q, sizeof a.q), memcpy(b.qd, a.qd, sizeof a.qd), b.limits = a.limits, b.g = a.g;
        memcpy(b.z_min, a.z_min, sizeof a.z_min), memcpy(b.z_max, a.z_max, sizeof a.z_max);
        memcpy(b.zd_max, a.zd_max, sizeof a.zd_max);
        faults = by_parts(k, late, &a, &ref, &at_a);
        CHECK(m.of->tick(&m, &b.limits, b.q, b.qd, &ref, b.z, b.zd, &at_b, room_of(m.of->scratch.tick)) == faults);
        ROOM_KEPT();
        CHECK(same(rows, held, held_b) && same(n, a.z, b.z) && same(n, a.zd, b.zd));
        CHECK(a.g.faults == b.g.faults && a.g.bad == b.g.bad && a.g.valid == b.g.valid);
        if (m.of->load == 0) CHECK(same_guard(&a.g, &b.g)); /* the tick knows the load, the guard by itself does not */
        went += faults == 0 && F > 0;
        beyond += (faults & ROLN_FAULT_RANGE) && in_box(k, &a, a.z, a.zd) && t % 8 != 3;
    }
    CHECK(went > 4 && beyond > 0);
}

/* ---- energy, limits --------------------------------------------------------------------------- */

static roln_real way[2][40 * MAXN], force[40 * MAXN]; /* a recording of the model: q, qd, torques that act from each sample on */

/* Records the model itself, as a machine, at 40 ticks. */
static void drive(int k, const rig *x, uint64_t *s)
{
    const instance m = of_rig(k, x);
    const int N = N_OF(k), F = F_OF(k);
    roln_real z[MAXN], zd[MAXN];
    int t;
    memcpy(z, x->z, sizeof z), memcpy(zd, x->zd, sizeof zd);
    for (t = 0; t < 40; t++) {
        dyadic(F, ROLN_C(0.5), s, force + t * F);
        CHECK_OK(m.of->decode(&m, z, zd, way[0] + t * N, way[1] + t * N, spare));
        CHECK_OK(m.of->step(&m, z, zd, force + t * F, x->limits.dt, spare));
    }
}

/* If the same torques act, the energy residual is the same, whenever they were sent, and so are limits from a recording. */
static void test_energy(int k, int late)
{
    static rig x;
    const instance base = of_rig(k, &x), m = late_of(k, late, &x);
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), D = m.of->delay;
    const roln_batch b = {1, 39, 1, NULL, way[0], way[1], NULL, force}, free = {1, 39, 1, NULL, way[0], way[1], NULL, NULL};
    roln_real each[2][2][MAXN];
    roln_limits found[2];
    roln_guard g;
    const guard_at at = {&g, held};
    uint64_t s = 74;
    ld most = 0;
    int t, i;
    good(k, &x);
    x.limits.dt = dt / 16, x.limits.tau = 1000, x.limits.residual = 1000, x.limits.margin = 1000;
    drive(k, &x, &s);
    memset(&g, 0, sizeof g), memset(&x.g, 0, sizeof x.g), fill(MAXN, 0, x.held), fill((1 + LONGEST) * MAXN, 0, held);
    for (i = 0; i < D; i++) /* on their way */
        memcpy(i + 1 < D ? held + (i + 2) * F : held, force + i * F, (size_t)F * sizeof *force);
    for (t = 0; t + D < 40; t++) {
        roln_real z[MAXN], zd[MAXN];
        CHECK_OK(base.of->encode(&base, way[0] + t * N, way[1] + t * N, z, zd, spare));
        const uint32_t faults = base.of->guard_tick(&base, &x.limits, way[0] + t * N, way[1] + t * N, z, zd, force + t * F,
                                                    &(const guard_at){&x.g, x.held}, spare);
        CHECK(m.of->guard_tick(&m, &x.limits, way[0] + t * N, way[1] + t * N, z, zd, force + (t + D) * F, &at, spare) == faults);
        CHECK(faults == 0 && x.g.valid && same_guard(&g, &x.g));
        most = fmaxl(most, fabsl((ld)g.residual));
    }
    CHECK(most > 0);
    for (i = 0; i < 2; i++) {
        const instance *of = i ? &m : &base;
        found[i] = x.limits, found[i].residual_window = 2;
        CHECK_OK(of->of->fit_limits(of, &b, 2, &found[i], each[i][0], each[i][1], spare));
    }
    CHECK(same(F, each[0][0], each[1][0]) && same(F, each[0][1], each[1][1]) && same(1, &found[0].residual, &found[1].residual));
    CHECK(same(1, &found[0].q_tolerance, &found[1].q_tolerance) && found[0].residual > 0 && n > 0);
    for (i = 0; i < 2; i++) { /* as if no torque had acted */
        const instance *of = i ? &m : &base;
        found[i] = x.limits, found[i].residual_window = 2;
        CHECK_OK(of->of->fit_limits(of, &free, 2, &found[i], each[i][0], each[i][1], spare));
    }
    CHECK(same(1, &found[0].residual, &found[1].residual) && found[0].tau >= 1000 && found[1].tau >= 1000);
}

/* A load that the tick is told of does not unbalance the energy of a machine under it. */
static void test_load(int late)
{
    static rig x;
    const int k = LADEN, n = n_OF(LADEN), F = F_OF(LADEN);
    const instance base = of_rig(k, &x), m = late_of(k, late, &x);
    const roln_real load[MAXN] = {4, -2}, none[MAXN] = {0};
    roln_real gain[MAXN];
    const target_at ref[2] = {{none, none, none, gain, gain, none}, {none, none, none, gain, gain, load}};
    ld most[2] = {0, 0};
    int told, t;
    fill(MAXN, 1, gain);
    for (told = 0; told < 2; told++) {
        const guard_at at = {&x.g, held};
        roln_real z[MAXN], zd[MAXN];
        uint64_t s = 75;
        good(k, &x);
        CHECK_OK(roln_ae_init(&m.of->md->ae, theta_k, &s, spare));
        memcpy(z, x.z, sizeof z), memcpy(zd, x.zd, sizeof zd);
        memset(&x.g, 0, sizeof x.g), fill((1 + LONGEST) * MAXN, 0, held);
        x.limits.tau = x.limits.residual = x.limits.margin = 1000, x.limits.strict = 0, x.limits.dt = dt / 64;
        for (t = 0; t < 20; t++) {
            CHECK_OK(base.of->decode(&base, z, zd, x.q, x.qd, spare));
            CHECK(m.of->tick(&m, &x.limits, x.q, x.qd, &ref[told], x.z, x.zd, &at, spare) == 0);
            CHECK_OK(base.of->push(&base, z, zd, held + F, load, x.limits.dt, spare));
            if (t > 0) most[told] = fmaxl(most[told], fabsl((ld)x.g.residual));
        }
    }
    CHECK(most[0] > 0.5L && n > 0);
    BOUND("delay: residual under a known load, over unknown", most[1] / most[0], 0.08);
}

/* ---- a loop ----------------------------------------------------------------------------------- */

/* Largest coordinate or velocity at the end of a loop that has to come to rest at 0, over those of its start; the machine is the
   model, and torques act `lag` ticks after they were sent, of which the controller `of` knows what it knows. */
static ld loop(int k, const model *of, int lag)
{
    enum { TICKS = 400 };
    static rig x;
    const instance base = of_rig(k, &x), m = {of, scale_of(k), x.z_min, x.z_max, x.zd_max, theta_k, NULL};
    const int n = n_OF(k), F = F_OF(k);
    roln_real z[MAXN] = {0}, zd[MAXN] = {0}, zero[MAXN] = {0}, kp[MAXN], kd[MAXN], M[MAXN * MAXN], queue[LONGEST + 1][MAXN];
    const terms_at out = {M, NULL, NULL, NULL, NULL, NULL};
    const target_at ref = {zero, zero, zero, kp, kd, NULL};
    const guard_at at = {&x.g, held};
    int t, i;
    good(k, &x);
    memset(&x.g, 0, sizeof x.g), fill((1 + LONGEST) * MAXN, 0, held), memset(queue, 0, sizeof queue);
    x.limits.tau = 10000, x.limits.strict = 0, x.limits.residual = 0, x.limits.margin = 10000, x.limits.dt = dt / 16;
    CHECK_OK(base.of->dynamics(&base, zero, zero, &out, spare));
    for (i = 0; i < n; i++) {
        const roln_real w = ROLN_C(0.25) / x.limits.dt; /* unstable from 0.65 / delay on, with the half tick that it is held */
        z[i] = ROLN_C(0.0078125), kp[i] = w * w * M[i * (n + 1)], kd[i] = 2 * w * M[i * (n + 1)];
    }
    for (t = 0; t < TICKS; t++) {
        if (base.of->decode(&base, z, zd, x.q, x.qd, spare) != ROLN_OK) return HUGE_VALL;
        (void)m.of->tick(&m, &x.limits, x.q, x.qd, &ref, x.z, x.zd, &at, spare);
        memcpy(queue[lag], held, (size_t)F * sizeof *held);
        if (base.of->step(&base, z, zd, queue[0], x.limits.dt, spare) != ROLN_OK || !roln_all_finite(n, zd)) return HUGE_VALL;
        memmove(queue[0], queue[1], sizeof queue - sizeof *queue);
    }
    return fmaxl(largest(n, z), largest(n, zd) * (ld)x.limits.dt * 4) / 0.0078125L;
}

/* Gains with which a loop that does not know of a delay of three ticks cannot come to rest: told, it comes to rest where it does on
   a machine without delay, which is not 0 where the autoencoder of random numbers is no exact one. */
static void test_loop(void)
{
    int k, rest = 0;
    for (k = 0; k < MODELS; k++) {
        ld none, told, unknown;
        if (models[k]->md->inputs > 0) continue;
        none = loop(k, models[k], 0), told = loop(k, delayed[1][k], 3), unknown = loop(k, models[k], 3);
        if (!(none < 20)) continue;
        BOUND("delay: loop that is told, off rest", fabsl(told - none), 0.01);
        CHECK(unknown > 50 + 10 * none);
        rest++;
    }
    CHECK(rest >= 6);
}

/* Parameters of another model are refused, and the state stays. */
static void test_mismatch(void)
{
    static plain_late_params none;
    static plain_late_ahead_work work;
    const roln_limits limits = {.dt = dt};
    static plain_late_guard g;
    plain_late_latent s = {{1, 2}, {3, 4}}, was = s;
    CHECK(plain_late_ahead(&none, &limits, &g, NULL, &s, &work) == ROLN_E_SHAPE && memcmp(&s, &was, sizeof s) == 0);
}

/* Without a delay there is nothing of it. */
static void test_none(void)
{
    CHECK(sizeof(plain_guard) == sizeof(roln_guard) + plain_force_size * sizeof(roln_real) && plain_delay == 0);
    CHECK(sizeof(plain_late_guard) == sizeof(roln_guard) + 4 * plain_force_size * sizeof(roln_real) && plain_late_delay == 3);
    CHECK(sizeof(plain_late_filter) == sizeof(plain_filter) && sizeof(plain_late_params) == sizeof(plain_params));
}

void TEST_NAME(delay)(void)
{
    int k, late;
    for (late = 0; late < LATE; late++, test_load(late - 1))
        for (k = 0; k < MODELS; k++) {
            test_sent(k, late);
            test_ahead(k, late);
            test_tick(k, late, 0);
            test_tick(k, late, 1);
            test_energy(k, late);
        }
    test_loop();
    test_mismatch();
    test_none();
    print_bounds();
}
