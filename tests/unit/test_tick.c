/* SPDX-License-Identifier: MIT */
/* A whole control tick: NAME_tick is the four calls that it is made of, motors, the first tick, angles on any turn; the functions
   of one model with structs of its own, and numbers of another config. */
#include <stdlib.h>

#define CALLED(X) X(encode) X(control) X(lift) X(allocate) X(guard_tick) X(tick)
#include "small.h"
#include "rig.h"

void TEST_NAME(tick)(void);

/* A tick by the four functions. */
static uint32_t four_calls(int k, rig *x, const target_at *ref)
{
    const instance m = of_rig(k, x);
    const roln_motors *motors = x->limits.motors;
    roln_real tau_z[MAXN];
    roln_status st = m.of->encode(&m, x->q, x->qd, x->z, x->zd, ROOM(encode));
    x->failed = st == ROLN_OK ? NOTHING : ENCODER;
    if (st == ROLN_OK) st = m.of->control(&m, x->z, x->zd, ref, tau_z, ROOM(control));
    if (st == ROLN_OK && !motors && m.of->md->inputs == 0) st = m.of->lift(&m, x->z, tau_z, x->want, ROOM(lift));
    else if (st == ROLN_OK) st = m.of->allocate(&m, x->z, motors, tau_z, x->want, &x->g.allocation_residual, ROOM(allocate));
    if (st != ROLN_OK && x->failed == NOTHING) x->failed = CONTROLLER;
    return tick(k, x);
}

/* NAME_tick is the four calls, bit for bit, with good and bad numbers, in and out of range and limits; with two motors, or those
   that the model has learned, too. */
static void test_tick(int k, int driven_by_two)
{
    enum { WELL, BAD_Q = 3, BAD_REFERENCE, BAD_RANGE, LOW_TAU, LOW_POWER, CASES };
    const uint32_t most = ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | ROLN_FAULT_LIMIT | ROLN_FAULT_RANGE;
    const roln_real little = ROLN_C(0.0009765625);
    const int N = N_OF(k), n = n_OF(k);
    static rig a, b;
    roln_real r[3 * MAXN], gain[2 * MAXN];
    const target_at ref = {r, r + n, r + 2 * n, gain, gain + n, NULL};
    static roln_real B[2 * MAXN];
    const int inputs = models[k]->md->inputs;
    const roln_motors motors = {.count = driven_by_two ? 2 : 0, .B = driven_by_two ? B : NULL, .mu = ROLN_C(0.25)};
    uint64_t s = 330 + (uint64_t)k;
    uint32_t seen = 0;
    int t, i, reached = 0, missed = 0;
    if (driven_by_two && (inputs > 0 || N < 2)) return;
    good(k, &a);
    dyadic(2 * N, 1, &s, B);
    if (driven_by_two || inputs > 0) a.limits.motors = &motors;
    a.limits.q_tolerance = a.limits.qd_tolerance = 100;
    fill(n, -100, a.z_min), fill(n, 100, a.z_max), fill(n, 100, a.zd_max);
    for (t = 0; t < 64; t++) {
        const int what = t % CASES;
        uint32_t f;
        dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd), dyadic(3 * n, 1, &s, r), dyadic(2 * n, 1, &s, gain);
        for (i = 0; i < N; i++)
            a.q[i] /= 16, a.qd[i] /= 64;
        if (what == BAD_Q) a.q[t % N] = (roln_real)NAN;
        if (what == BAD_REFERENCE) r[t % (3 * n)] = (roln_real)INFINITY;
        if (what == BAD_RANGE) a.zd_max[t % n] = t % 16 == BAD_RANGE ? 0 : 100;
        if (t % 16 == 1) a.g.bad = 0, a.g.faults = 0;
        if (t == 40) a.limits.q_tolerance = a.limits.qd_tolerance = 0;
        a.limits.tau = what == LOW_TAU ? little : 1000;
        a.limits.residual = what == LOW_POWER ? little : 1000;
        if (t == 48) a.limits.residual = 0;
        b = a;
        fill(MAXN, 0, a.want);
        f = four_calls(k, &a, &ref);
        CHECK(one_call(k, &b, &ref) == f);
        CHECK(same_guard(&a.g, &b.g) && same(N, a.held, b.held) && same(n, a.z, b.z) && same(n, a.zd, b.zd));
        seen |= f, reached += f == 0 && a.g.valid, missed += a.g.allocation_residual > 0 && a.g.allocation_residual <= 1;
    }
    CHECK(!a.limits.motors == !missed);
    CHECK(reached > 2); /* all well, the balance known */
    CHECK((seen & (most | ROLN_FAULT_OUTPUT)) == most);
    /* in these few states have any balance */
    CHECK(k == BARE || k == SQUARE || k == WHEEL || k == RUBBED || inputs > 0 || (seen & ROLN_FAULT_ENERGY));
}

/* Motors that no machine has, with arrays in places of their own (address sanitizer): of one whose damping is none there are two
   numbers, which are held; of one that is not counted none is read, and its torque is 0 where each has a limit, once it has expired
   too. A whole tick does not allocate to them. */
static void test_guard_uncounted(int k, const roln_motors *wrong, const rig *start)
{
    static rig x;
    const instance m = of_rig(k, &x);
    const guard_at held = {&x.g, x.held};
    const int F = F_OF(k), two = wrong->count == 2 && wrong->B && models[k]->md->inputs == 0;
    const size_t size = (size_t)(two ? 2 : 1) * sizeof(roln_real);
    roln_real zero[5 * MAXN] = {0};
    const target_at ref = {zero, zero, zero, zero, zero, NULL};
    roln_real *own[4];
    int i, t;
    for (i = 0; i < 4; i++) {
        own[i] = (roln_real *)malloc(size);
        fill(two ? 2 : 1, i == 0 ? (roln_real)NAN : ROLN_C(1.5), own[i]);
    }
    x = *start, x.limits.motors = wrong;
    CHECK((one_call(k, &x, &ref) & (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS)) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
    CHECK(same(F, x.held, start->held));
    x = *start, x.limits.motors = wrong, x.limits.hold = 1;
    x.limits.tau_each = own[1], x.limits.rate_each = own[2], x.limits.safe = own[3];
    for (t = 0; t < 2; t++) {
        const uint32_t f = m.of->guard_tick(&m, &x.limits, x.q, x.qd, x.z, x.zd, own[0], &held, ROOM(guard_tick));
        CHECK((f & ROLN_FAULT_INPUT) && !(f & ROLN_CLIPPED) && !(f & ROLN_FAULT_EXPIRED) == !t);
        if (two) CHECK(t ? all(2, x.held, ROLN_C(1.5)) : same(2, x.held, start->held));
        else CHECK(all(F, x.held, 0));
    }
    for (i = 0; i < 4; i++)
        free(own[i]);
}

/* Motors u, tau = B u, are to a guard what the joints' tau = B u is: the same residual of energy. Motors that no machine has are a
   fault, and the torque is held. */
static void test_guard_motors(int k)
{
    static rig a, b, bad;
    static roln_real B[2 * MAXN];
    const int N = N_OF(k), n = n_OF(k), inputs = models[k]->md->inputs;
    const roln_motors one = {.count = 1, .B = B}, two = {.count = 2, .B = B};
    const roln_motors wrong[5] = {{.B = B},
                                  {.count = N + 1, .B = B},
                                  {.count = 2, .B = B, .mu = -1},
                                  {.count = 2, .B = B, .mu = (roln_real)NAN},
                                  {.count = 2, .B = inputs > 0 ? B : NULL}};
    uint64_t s = 360 + (uint64_t)k;
    int t, i, known = 0;
    good(k, &bad);
    dyadic(2 * N, ROLN_C(0.25), &s, B);
    for (i = 0; i < 5; i++) {
        rig x = bad;
        x.limits.motors = wrong + i;
        CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && x.g.bad == 1 && same(F_OF(k), x.held, bad.held));
        test_guard_uncounted(k, wrong + i, &bad);
    }
    good(k, &a);
    memset(&a.g, 0, sizeof a.g);
    fill(MAXN, 0, a.held);
    a.limits.tau = 100, a.limits.residual = 1000, b = a;
    if (inputs == 0) {
        b.limits.motors = &one;
        CHECK(tick(k, &b) == 0 && same(1, b.held, b.want) && all(MAXN - 1, b.held + 1, 0));
        b = a;
    }
    if (inputs > 0 || N < 2) return;
    a.limits.motors = &two;
    for (t = 0; t < 10; t++) {
        dyadic(2, 1, &s, a.want), dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd);
        dyadic(n, ROLN_C(0.5), &s, a.z), dyadic(n, ROLN_C(0.0625), &s, a.zd);
        memcpy(b.z, a.z, sizeof a.z), memcpy(b.zd, a.zd, sizeof a.zd);
        memcpy(b.q, a.q, sizeof a.q), memcpy(b.qd, a.qd, sizeof a.qd);
        for (i = 0; i < N; i++)
            b.want[i] = B[2 * i] * a.want[0] + B[2 * i + 1] * a.want[1];
        a.want[2] = (roln_real)NAN; /* is nobody's torque */
        CHECK(tick(k, &a) == 0 && tick(k, &b) == 0);
        CHECK(same(2, a.held, a.want) && all(N - 2, a.held + 2, 0));
        BOUND("residual of motors, eps", fabsl((ld)a.g.residual - (ld)b.g.residual) / EPS, 20);
        known += a.g.valid && b.g.valid && ROLN_ABS(b.g.residual) > ROLN_C(0.001);
    }
    CHECK(known > 5);
}

/* The very first tick, with NaN among the measured numbers: the latent state is not read (here it has never been written, which
   memory sanitizers see) and not written, the torque is 0, then what a good tick gave, for `hold` ticks. */
static void test_first_tick(int k)
{
    const int N = N_OF(k), n = n_OF(k);
    static rig start, x;
    roln_real zero[5 * MAXN] = {0}, torque[MAXN];
    const target_at ref = {zero, zero, zero, zero, zero, NULL};
    const guard_at held = {&x.g, x.held};
    roln_real *unset = (roln_real *)malloc((size_t)(2 * n) * sizeof *unset);
    uint64_t s = 335 + (uint64_t)k;
    int i, t;
    const roln_motors damped = {.mu = ROLN_C(0.25)};
    memset(&start, 0, sizeof start);
    valid(k, &s);
    if (models[k]->md->inputs > 0) start.limits.motors = &damped;
    dyadic(N, ROLN_C(0.125), &s, start.q), dyadic(N, ROLN_C(0.125), &s, start.qd);
    start.limits.dt = ROLN_C(0.0625), start.limits.residual = 1000, start.limits.q_tolerance = start.limits.qd_tolerance = 1000;
    start.limits.tau = 1000, start.limits.hold = 3;
    fill(n, -1000, start.z_min), fill(n, 1000, start.z_max), fill(n, 1000, start.zd_max);
    memset(start.z, 0xa5, sizeof start.z), memset(start.zd, 0x5a, sizeof start.zd);
    for (i = 0; i < 2 * N; i++) {
        const instance m = of_rig(k, &x);
            x = start;
        (i < N ? x.q : x.qd)[i % N] = (roln_real)NAN;
        CHECK(one_call(k, &x, &ref) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
        CHECK(memcmp(x.z, start.z, sizeof x.z) == 0 && memcmp(x.zd, start.zd, sizeof x.zd) == 0);
        CHECK(all(N, x.held, 0) && x.g.bad == 1 && x.g.valid == 0);
        CHECK(m.of->tick(&m, &x.limits, x.q, x.qd, &ref, unset, unset + n, &held, ROOM(tick)) ==
              (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
        CHECK(all(N, x.held, 0) && x.g.bad == 2);
    }
    free(unset);
    memcpy(x.q, start.q, sizeof x.q), memcpy(x.qd, start.qd, sizeof x.qd);
    CHECK(one_call(k, &x, &ref) == 0 && x.g.bad == 0);
    memcpy(torque, x.held, sizeof torque);
    x.q[0] = (roln_real)NAN;
    for (t = 1; t <= 4; t++) {
        const uint32_t expired = t > 3 ? ROLN_FAULT_EXPIRED : 0;
        CHECK(one_call(k, &x, &ref) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | expired));
        CHECK(expired ? all(N, x.held, 0) : same(N, x.held, torque));
    }
}

/* An angle's error goes the shorter way, and its turns change neither control nor what a guard sees. */
static void test_turns(void)
{
    const int k = WHEEL, n = wheel_n;
    const instance m = of_model(k);
    const roln_real turn = 2 * ROLNI_PI, far = ROLN_C(3.0), little = ROLN_C(0.0009765625);
    roln_real r[3 * wheel_n] = {0}, gain[2 * wheel_n], tau[2][wheel_n], z[wheel_n], zd[wheel_n] = {0};
    const target_at ref = {r, r + n, r + 2 * n, gain, gain + n, NULL};
    static rig x, start;
    int i, j;
    good(k, &start);
    fill(n, 4, gain), fill(n, 0, gain + n);
    for (i = 0; i < n; i++)
        for (j = 0; j < 2; j++) { /* from -3 to 3 by .28 rad backwards, not by 6 forwards */
            fill(n, 0, z), fill(3 * n, 0, r);
            z[i] = -far, r[i] = j ? far : -far;
            CHECK_OK(m.of->control(&m, z, zd, &ref, tau[j], ROOM(control)));
            if (j == 1) CHECK_NEAR(tau[1][i] - tau[0][i], 4 * (i == 1 ? 2 * (ld)far : 2 * (ld)far - (ld)turn), 40 * EPS);
        }
    memcpy(start.q, start.z, sizeof start.q), memcpy(start.qd, start.zd, sizeof start.qd);
    start.limits.q_tolerance = start.limits.qd_tolerance = little;
    for (i = 0; i < n; i++) /* measured on another turn than the state: the same place; of a slider it is not */
        for (j = -1; j < 2; j += 2) {
            x = start, x.q[i] += (roln_real)j * turn;
            CHECK(tick(k, &x) == (i == 1 ? ROLN_FAULT_MANIFOLD : 0));
            x = start, x.q[i] += 4 * little;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x = start, x.z[i] = x.q[i] = x.z[i] + 20 * (roln_real)j * turn; /* no jump of energy by a turn */
            CHECK(tick(k, &x) == (i == 1 ? ROLN_FAULT_RANGE : 0));
        }
}

/* ---- one model, with structs of its own ------------------------------------------------------- */

/* Scratch of a function, and not a number more. */
#define RICH_WORK(function) ((void *)room_of(rich_called.scratch.function))
#define PLAIN_WORK(function) ((void *)room_of(plain_called.scratch.function))
#define SPARE ((void *)spare)

/* The parameters and the state of a rig, typed. */
static void typed_rig(const rig *x, rich_params *p, rich_state *full, rich_latent *s)
{
    p->slope = rich_model.ae.slope, p->eigenvalue_floor = rich_model.lnn.eigenvalue_floor, p->scale = scale;
    memcpy(p->theta, theta_k, sizeof p->theta);
    memcpy(p->z_min, x->z_min, sizeof p->z_min), memcpy(p->z_max, x->z_max, sizeof p->z_max);
    memcpy(p->zd_max, x->zd_max, sizeof p->zd_max);
    memcpy(full->q, x->q, sizeof full->q), memcpy(full->qd, x->qd, sizeof full->qd);
    memcpy(s->z, x->z, sizeof s->z), memcpy(s->zd, x->zd, sizeof s->zd);
}

/* Scratch of exactly the size of its type, and any other: the same bits. Gains stay, the last number counts. */
static void test_typed(void)
{
    static rich_params p;
    static rich_guard g;
    static rig x;
    rich_state full;
    rich_latent s, s1;
    rich_target r, r1;
    rich_jacobian jac, jac1;
    roln_real v[6], y[6], y1[6], zd2[3], a[3], motors[6 * 4], u[5], u1[5];
    roln_motors four = {.count = 4, .B = motors, .mu = ROLN_C(0.5)};
    uint64_t seed = 330;
    good(RICH, &x);
    typed_rig(&x, &p, &full, &s);
    dyadic(6, 1, &seed, v), dyadic(3, 1, &seed, zd2), dyadic(3, 1, &seed, r.kp), dyadic(3, 1, &seed, r.kd),
        dyadic(24, 1, &seed, motors);
    r1 = r;
    CHECK_OK(rich_encode_reference(&p, full.q, full.qd, v, &r, RICH_WORK(encode_reference)));
    ROOM_KEPT();
    CHECK_OK(rich_encode_reference(&p, full.q, full.qd, v, &r1, SPARE));
    CHECK(memcmp(&r, &r1, sizeof r) == 0); /* the gains as they were */
    CHECK_OK(rich_inverse(&p, &s, zd2, r.kp, a, RICH_WORK(inverse)));
    CHECK(rich_inverse(&p, &s, zd2, r.kp, y1, SPARE) == ROLN_OK && same(3, a, y1));
    CHECK_OK(rich_control(&p, &s, &r, a, RICH_WORK(control)));
    CHECK(rich_control(&p, &s, &r, y1, SPARE) == ROLN_OK && same(3, a, y1));
    CHECK_OK(rich_inertia(&p, &s, v, y, RICH_WORK(inertia)));
    CHECK(rich_inertia(&p, &s, v, y1, SPARE) == ROLN_OK && same(6, y, y1));
    CHECK_OK(rich_allocate(&p, &s, &four, zd2, u, u + 4, RICH_WORK(allocate)));
    CHECK(rich_allocate(&p, &s, &four, zd2, u1, u1 + 4, SPARE) == ROLN_OK && same(5, u, u1));
    four.count = 2, four.B = p.theta + rich_theta_size - 12; /* what it has learned */
    CHECK_OK(rich_allocate(&p, &s, &four, zd2, u1, u1 + 4, SPARE));
    four.count = 7, four.B = NULL;
    CHECK(rich_allocate(&p, &s, &four, zd2, u, u + 4, RICH_WORK(allocate)) == ROLN_OK && same(2, u, u1) && same(1, u + 4, u1 + 4));
    s1 = s;
    CHECK_OK(rich_linear(&p, &s1, v, dt, &jac, RICH_WORK(linear)));
    ROOM_KEPT();
    s1 = s;
    CHECK_OK(rich_linear(&p, &s1, v, dt, &jac1, SPARE));
    CHECK(same(36, jac.A, jac1.A) && same(12, jac.B, jac1.B));
    memset(&g, 0, sizeof g);
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == 0 && same(2, g.tau, x.want));
    ROOM_KEPT();
    full.qd[5] = (roln_real)NAN; /* the last number counts */
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_INPUT);
    CHECK(same(2, g.tau, x.want) && g.g.bad == 1);
    full.qd[5] = 0, p.zd_max[2] = -1;
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_RANGE);
    CHECK(g.g.faults == (ROLN_FAULT_INPUT | ROLN_FAULT_RANGE));
    CHECK(rich_guard_tick(&p, &x.limits, &full, NULL, NULL, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_STATUS &&
          same(2, g.tau, x.want));
}

/* NAME_tick, too: a first tick with NaN leaves s, one without follows. */
static void test_typed_tick(void)
{
    static plain_params p;
    static plain_guard g;
    static plain_start start;
    const roln_limits limits = {.dt = dt, .tau = 1000, .hold = 2};
    plain_state x = {{0, 0, 0, 0, 0, (roln_real)NAN}, {0}};
    plain_target r = {{0}, {0}, {0}, {1, 1}, {1, 1}};
    plain_latent s, was;
    uint64_t seed = 331;
    CHECK_OK(plain_init(&p, &seed, &start.init));
    fill(2, -9, p.z_min), fill(2, 9, p.z_max), fill(2, 9, p.zd_max);
    memset(&s, 0xa5, sizeof s), memset(&was, 0xa5, sizeof was);
    CHECK(plain_tick(&p, &limits, &x, &r, &s, &g, PLAIN_WORK(tick)) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
    ROOM_KEPT();
    CHECK(memcmp(&s, &was, sizeof s) == 0 && all(6, g.tau, 0) && g.g.bad == 1);
    x.q[5] = ROLN_C(0.25);
    CHECK(plain_tick(&p, &limits, &x, &r, &s, &g, PLAIN_WORK(tick)) == 0 && largest(6, g.tau) > 0 && g.g.bad == 0);
    CHECK(plain_in_range(&p, &s));
}

/* Numbers of another config: everything is refused, and nothing is written. */
static void refused(plain_params *p)
{
    static struct {
        plain_state x;
        plain_latent s;
        plain_target r;
        plain_equation e;
        plain_jacobian j;
        roln_real tau_z[2], tau[6];
    } to, was;
    static plain_guard g;
    const roln_limits limits = {.dt = dt, .tau = 1000, .hold = 2};
    const plain_params before = *p;
    const plain_state x = {{0}, {0}};
    const plain_latent s = {{0}, {0}}, along[2] = {{{0}, {0}}, {{0}, {0}}};
    const plain_target r = {{0}, {0}, {0}, {1, 1}, {1, 1}};
    const roln_real v[36] = {0};
    const roln_motors motors = {.count = 1, .B = v, .mu = 1};
    const roln_cost cost = {v, v, v, dt, &motors};
    memset(&to, 0xa5, sizeof to), was = to;
    memset(&g, 0, sizeof g);
    CHECK(plain_encode(p, &x, &to.s, PLAIN_WORK(encode)) == ROLN_E_SHAPE);
    CHECK(plain_decode(p, &s, &to.x, PLAIN_WORK(decode)) == ROLN_E_SHAPE);
    CHECK(plain_encode_reference(p, v, v, v, &to.r, PLAIN_WORK(encode_reference)) == ROLN_E_SHAPE);
    CHECK(plain_control(p, &s, &r, to.tau_z, PLAIN_WORK(control)) == ROLN_E_SHAPE);
    CHECK(plain_lift(p, &s, v, to.tau, PLAIN_WORK(lift)) == ROLN_E_SHAPE);
    CHECK(plain_gains(p, &s, v, v, &to.r, PLAIN_WORK(gains)) == ROLN_E_SHAPE);
    CHECK(plain_lqr(p, &cost, &s, NULL, to.tau, NULL, PLAIN_WORK(lqr)) == ROLN_E_SHAPE);
    CHECK(plain_lqr_along(p, &cost, 1, along, NULL, NULL, to.tau, PLAIN_WORK(lqr_along)) == ROLN_E_SHAPE);
    CHECK(plain_allocate(p, &s, &motors, v, to.tau, NULL, PLAIN_WORK(allocate)) == ROLN_E_SHAPE);
    CHECK(plain_step(p, &to.s, NULL, dt, PLAIN_WORK(step)) == ROLN_E_SHAPE);
    CHECK(plain_linear(p, &to.s, NULL, dt, &to.j, PLAIN_WORK(linear)) == ROLN_E_SHAPE);
    CHECK(plain_reduce(p, &s, v, to.tau_z, PLAIN_WORK(reduce)) == ROLN_E_SHAPE);
    CHECK(plain_inverse(p, &s, NULL, v, to.tau_z, PLAIN_WORK(inverse)) == ROLN_E_SHAPE);
    CHECK(plain_dynamics(p, &s, &to.e, PLAIN_WORK(dynamics)) == ROLN_E_SHAPE);
    CHECK(plain_inertia(p, &s, v, to.tau, PLAIN_WORK(inertia)) == ROLN_E_SHAPE);
    CHECK(plain_fit_range(p, 1, v, v, PLAIN_WORK(fit_range)) == ROLN_E_SHAPE);
    CHECK(!plain_in_range(p, &s));
    CHECK(plain_guard_tick(p, &limits, &x, &s, v, &g, PLAIN_WORK(guard_tick)) == ROLN_FAULT_STATUS && g.g.bad == 1);
    CHECK(plain_tick(p, &limits, &x, &r, &to.s, &g, PLAIN_WORK(tick)) == ROLN_FAULT_STATUS && g.g.bad == 2);
    CHECK(memcmp(&to, &was, sizeof to) == 0 && memcmp(p, &before, sizeof before) == 0 && all(6, g.tau, 0));
}

static void test_params_mismatch(void)
{
    static plain_params p, zero;
    static plain_start start;
    uint64_t seed = 332;
    CHECK_OK(plain_init(&p, &seed, &start.init));
    fill(2, -9, p.z_min), fill(2, 9, p.z_max), fill(2, 9, p.zd_max);
    p.slope *= 1 + ROLN_EPS, refused(&p), p.slope = plain_model.ae.slope;
    p.eigenvalue_floor /= 2, refused(&p), p.eigenvalue_floor = (roln_real)NAN, refused(&p);
    refused(&zero);
}

void TEST_NAME(tick)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_tick(k, 0);
        test_tick(k, 1);
        test_guard_motors(k);
        test_first_tick(k);
    }
    test_turns();
    test_typed();
    test_typed_tick();
    test_params_mismatch();
    print_bounds();
}
