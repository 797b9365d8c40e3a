/* SPDX-License-Identifier: MIT */
/* test_safety.c - what watches over a running program: NAME_check over the parameters; interrupts with scratch of their own, in
   every fence of a kernel (ROLN_FENCE); parameters of another model, which every function refuses; texts of statuses and
   faults. */
#undef ROLN_SIMD
#define ROLN_SIMD 0
static void interrupt(void);
#define ROLN_FENCE interrupt()

#define ROLN_NAME arm
#define ROLN_AE 6, 5, 2
#define ROLN_MLP 16, 16
#define ROLN_GN_ROWS 4
#define ROLN_PLAN 3, 6
#include "roln.h"

#define ROLN_NAME driven /* with inputs, without an autoencoder */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_INPUTS 2
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME half
#define ROLN_AE 6, 5, 2
#define ROLN_MLP 16, 16
#define ROLN_QUANTISE half
#include "roln.h"

#define ROLN_NAME bytes
#define ROLN_AE 6, 5, 2
#define ROLN_MLP 16, 16
#define ROLN_QUANTISE int8
#include "roln.h"
#endif

#include "check.h"

void TEST_NAME(safety)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)
static uint64_t seed = 1;

/* ---- parameters in memory --------------------------------------------------------------------- */

/* CRC-32 from its definition: a bit at a time. */
static uint32_t slow_crc(size_t count, const unsigned char *bytes)
{
    uint32_t crc = 0xffffffff;
    size_t i;
    int k;
    for (i = 0; i < count; i++)
        for (crc ^= bytes[i], k = 0; k < 8; k++)
            crc = crc >> 1 ^ (crc & 1 ? 0xedb88320 : 0);
    return ~crc;
}

/* The bytes of numbers from the least significant one on. */
static size_t little_endian(int count, const void *numbers, unsigned char *bytes)
{
    size_t at = 0, k;
    int i;
    for (i = 0; i < count; i++) {
        roln_bits b;
        memcpy(&b, (const unsigned char *)numbers + (size_t)i * sizeof b, sizeof b);
        for (k = 0; k < sizeof b; k++, b >>= 8)
            bytes[at++] = (unsigned char)(b & 255);
    }
    return at;
}

typedef roln_status check_of(const void *p, int count, roln_check *c);

/* The next status other than ROLN_OK, in at most `calls` calls with count numbers each; their number is left in calls. */
static roln_status await(check_of *check, const void *p, int count, int *calls, roln_check *c)
{
    const int most = *calls;
    roln_status st = ROLN_OK;
    for (*calls = 0; *calls < most && st == ROLN_OK; ++*calls)
        st = check(p, count, c);
    return st;
}

/* One or two bits of the parameters flip somewhere in a pass: seen within two. */
static void check_flips(check_of *check, int size, unsigned char *p, int bits)
{
    const int count = 7, pass = (size + count - 1) / count;
    roln_check fresh = {0, 0, 0, 0};
    int k, unseen = 0;
    CHECK_OK(check(p, size, &fresh));
    for (k = 0; k < 2000; k++) {
        const int all = size * (int)sizeof(roln_real) * 8, a = roln_randint(all, &seed), b = roln_randint(all, &seed);
        roln_check c = fresh;
        int before = roln_randint(pass, &seed), calls = 2 * pass;
        if (await(check, p, count, &before, &c) != ROLN_OK) unseen++;
        p[a / 8] ^= (unsigned char)(1 << a % 8);
        if (bits == 2 && a != b) p[b / 8] ^= (unsigned char)(1 << b % 8);
        if (await(check, p, count, &calls, &c) != ROLN_E_CHECKSUM) unseen++;
        p[a / 8] ^= (unsigned char)(1 << a % 8);
        if (bits == 2 && a != b) p[b / 8] ^= (unsigned char)(1 << b % 8);
        if (check(p, count, &c) != ROLN_E_CHECKSUM) unseen++; /* it stays */
    }
    CHECK(unseen == 0);
}

static void check_check(check_of *check, int size, unsigned char *p)
{
    static unsigned char bytes[40000];
    roln_check c = {0, 0, 0, 0}, was;
    uint32_t want;
    int slice, calls;
    CHECK((size_t)size * sizeof(roln_real) <= sizeof bytes);
    want = slow_crc(little_endian(size, p, bytes), bytes);
    for (slice = 1; slice <= 64; slice *= 2) { /* the same sum in slices of any size; then pass upon pass is ROLN_OK */
        memset(&c, 0, sizeof c);
        calls = (size + slice - 1) / slice - 1;
        CHECK_OK(await(check, p, slice, &calls, &c));
        CHECK(!c.valid && c.at > 0 && c.at < size);
        CHECK_OK(check(p, slice, &c));
        CHECK(c.valid && c.reference == want && c.at == 0 && c.sum == 0);
        calls = 5 * size / slice;
        CHECK_OK(await(check, p, slice, &calls, &c));
    }
    was = c;
    CHECK(check(p, 0, &c) == ROLN_E_LENGTH && check(p, -1, &c) == ROLN_E_LENGTH && memcmp(&c, &was, sizeof c) == 0);
    /* a reference that was given, right and wrong; the state itself damaged */
    memset(&c, 0, sizeof c);
    c.reference = want, c.valid = 1;
    CHECK_OK(check(p, 2 * size, &c));
    c.reference ^= 1;
    CHECK(check(p, size, &c) == ROLN_E_CHECKSUM && check(p, 1, &c) == ROLN_E_CHECKSUM);
    c = was, c.at = -1;
    CHECK(check(p, 1, &c) == ROLN_E_CHECKSUM);
    c = was, c.at = size;
    CHECK(check(p, 1, &c) == ROLN_E_CHECKSUM);
    memset(&c, 0, sizeof c), c.at = size; /* in a first pass, which would take any sum for the reference */
    CHECK(check(p, 1, &c) == ROLN_E_CHECKSUM && !c.valid);
    c = was, c.at = 0, c.sum = 1;
    CHECK(check(p, size, &c) == ROLN_E_CHECKSUM);
    check_flips(check, size, p, 1);
    check_flips(check, size, p, 2);
}

#define CHECK_MODEL(of) \
    static roln_status of##_check_of(const void *p, int count, roln_check *c) \
    { \
        return of##_check(p, count, c); \
    } \
    static void test_check_##of(void) \
    { \
        static of##_params p; \
        unsigned char *bytes = (unsigned char *)&p; \
        size_t i; \
        for (i = 0; i < sizeof p; i++) \
            bytes[i] = (unsigned char)(roln_rand(&seed) & 255); \
        CHECK(sizeof p == of##_numbers * sizeof(roln_real)); \
        check_check(of##_check_of, of##_numbers, bytes); \
    }
CHECK_MODEL(arm)
CHECK_MODEL(driven)
#ifndef ROLN_DOUBLE
CHECK_MODEL(half)
CHECK_MODEL(bytes)
#endif

/* ---- interrupts ------------------------------------------------------------------------------- */

static arm_params p;
static arm_work work, own;
static arm_train train;
static const arm_state x = {{ROLN_C(0.1), ROLN_C(0.2)}, {ROLN_C(0.3)}};
static const roln_limits limits = {.dt = ROLN_C(0.01), .margin = 1000, .tau = 1000, .hold = 5};

/* What interrupts, in every at-th fence. */
static int at, fences, wrong;
static arm_latent seen; /* what it computes */
static void interrupt(void)
{
    arm_latent s;
    if (at == 0 || ++fences % at != 0) return;
    at = 0; /* it is not interrupted itself */
    wrong += arm_encode(&p, &x, &s, &own.encode) != ROLN_OK || memcmp(&s, &seen, sizeof s) != 0;
}

/* A step of motion, and a tick, interrupted in one fence: they and what interrupts are right. */
static void test_interrupt(void)
{
    arm_latent s, want, start = {{ROLN_C(0.1), ROLN_C(-0.2)}, {ROLN_C(0.3), ROLN_C(0.4)}};
    const arm_target r = {{0}, {0}, {0}, {1, 1}, {1, 1}};
    int k, places;
    CHECK_OK(arm_encode(&p, &x, &seen, &own.encode));
    want = start;
    at = 1 << 30, fences = 0;
    CHECK_OK(arm_step(&p, &want, NULL, limits.dt, &work.step));
    places = fences;
    CHECK(places > 10);
    wrong = 0;
    for (k = 1; k <= places; k++) {
        at = k, fences = 0, s = start;
        CHECK_OK(arm_step(&p, &s, NULL, limits.dt, &work.step));
        CHECK(at == 0 && memcmp(&s, &want, sizeof s) == 0);
    }
    for (k = 1; k <= 20; k++) {
        static arm_guard guard, free_guard;
        at = 0;
        CHECK(arm_tick(&p, &limits, &x, &r, &want, &free_guard, &work.tick) == 0);
        at = k, fences = 0;
        CHECK(arm_tick(&p, &limits, &x, &r, &s, &guard, &work.tick) == 0);
        CHECK(at == 0 && memcmp(&s, &want, sizeof s) == 0 && memcmp(&guard, &free_guard, sizeof guard) == 0);
    }
    CHECK(wrong == 0);
    at = 0;
}

/* ---- parameters of another model -------------------------------------------------------------- */

/* Calls of everything that takes scratch: the statuses, and 1 if all outputs but guards are as they were. */
typedef struct {
    roln_status st[28];
    uint32_t faults[3];
    int count, kept;
} calls;

#define CALL(expression) (c->st[c->count++] = (expression))

/* A plan. */
static void call_plan(calls *c)
{
    static const roln_real ones[6] = {1, 1, 1, 1, 1, 1}, none[6] = {0};
    static const roln_limits of = {.dt = ROLN_C(0.01), .margin = 1, .tau = 1};
    const roln_term term = {.of = ROLN_OF_Q, .weight = ones, .ref = none};
    const roln_goal goal = {.dt = ROLN_C(0.01), .terms = 1, .term = &term, .u = ones, .limits = &of};
    const arm_latent at_rest = {{0}, {0}};
    static arm_plan_next_work next_work;
    static arm_plan_linear_work linear_work;
    static struct {
        arm_plan plan;
        roln_real A[3 * 4 * arm_n * arm_n], B[3 * 2 * arm_n * 6], c[3 * 2 * arm_n];
    } o, was;
    memset(&o, 0, sizeof o);
    was = o;
    CALL(arm_plan_next(&p, &goal, &at_rest, &o.plan, &next_work));
    CALL(arm_plan_linear(&p, &goal, &o.plan, o.A, o.B, o.c, &linear_work));
    c->kept &= memcmp(&o, &was, sizeof o) == 0;
}

/* Gains, feedback of least cost, plans. */
static void call_feedback(calls *c)
{
    static const roln_real ones[6] = {1, 1, 1, 1, 1, 1}, none[6] = {0};
    const roln_cost cost = {ones, ones, ones, limits.dt, NULL};
    const arm_latent at_rest[2] = {{{0}, {0}}, {{0}, {0}}};
    static arm_lqr_work lqr_work;
    static arm_lqr_along_work along_work;
    static struct {
        arm_target r;
        roln_real K[2][6 * 2 * arm_n], P[4 * arm_n * arm_n];
    } o, was;
    memset(&o, 0, sizeof o);
    was = o;
    CALL(arm_gains(&p, at_rest, ones, ones, &o.r, &work.gains));
    CALL(arm_lqr(&p, &cost, at_rest, none, o.K[0], o.P, &lqr_work));
    CALL(arm_lqr_along(&p, &cost, 1, at_rest, none, NULL, o.K[1], &along_work));
    c->kept &= memcmp(&o, &was, sizeof o) == 0;
    call_plan(c);
}

/* A filter and its noise. */
static void call_filter(calls *c)
{
    static const roln_real y[12] = {ROLN_C(0.1), ROLN_C(0.2)};
    const roln_batch b = {1, 1, 1, NULL, y, NULL, NULL, NULL};
    static arm_filter_tick_work filterwork;
    static struct {
        arm_filter f;
        roln_noise noise;
        roln_real each[6];
    } o, was;
    memset(&o, 0, sizeof o);
    o.noise.dt = limits.dt, o.noise.q = 1;
    was = o;
    CALL(arm_fit_noise(&p, &b, &o.noise, o.each, NULL, &train.fit_noise));
    c->faults[2] = arm_filter_tick(&p, &o.noise, y, NULL, &o.f, &filterwork);
    CHECK(o.f.f.faults == c->faults[2]);
    o.f.f.faults = 0;
    c->kept &= memcmp(&o, &was, sizeof o) == 0;
}

static void call_all(calls *c)
{
    static const roln_real q[12] = {ROLN_C(0.1)}, qd[12] = {ROLN_C(0.2)};
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    const arm_latent at_rest = {{0}, {0}};
    static struct {
        arm_latent z[3];
        arm_state full;
        arm_target r;
        roln_real tau_z[2], tau[6], u[2], y[6], forces[2];
        arm_equation e;
        arm_jacobian j;
        arm_params p;
        arm_optimiser o;
        arm_gradient g1, g2;
        arm_residuals rows;
        roln_error error, joints[arm_N], windows[4];
        roln_loss var;
        roln_limits limits;
        roln_real most[12];
    } o, was;
    static arm_linear_work linwork;
    arm_guard g[2];
    const roln_batch b = {2, 0, 1, NULL, q, qd, q, q}, motion = {1, 1, 1, NULL, q, qd, NULL, q};
    const roln_motors one = {1, q, 1};
    memset(&o, 0, sizeof o);
    o.p = p, o.limits = limits, o.g1.windows = o.g2.windows = 1;
    was = o;
    memset(c, 0, sizeof *c), memset(g, 0, sizeof g);
    CALL(arm_encode(&p, &x, o.z, &work.encode));
    CALL(arm_decode(&p, &at_rest, &o.full, &work.decode));
    CALL(arm_encode_reference(&p, q, qd, q, &o.r, &work.encode_reference));
    CALL(arm_control(&p, &at_rest, &o.r, o.tau_z, &work.control));
    CALL(arm_lift(&p, &at_rest, q, o.tau, &work.lift));
    CALL(arm_allocate(&p, &at_rest, &one, q, o.u, o.u + 1, &work.allocate));
    CALL(arm_step(&p, o.z + 1, q, limits.dt, &work.step));
    CALL(arm_reduce(&p, &at_rest, q, o.tau_z, &work.reduce));
    CALL(arm_inverse(&p, &at_rest, NULL, q, o.tau_z, &work.inverse));
    CALL(arm_dynamics(&p, &at_rest, &o.e, &work.dynamics));
    CALL(arm_inertia(&p, &at_rest, qd, o.y, &work.inertia));
    CALL(arm_fit_range(&o.p, 1, q, qd, &train.fit_range));
    CALL(arm_fit_limits(&p, &motion, 2, &o.limits, o.most, o.most + 6, &train.fit_limits));
    CALL(arm_linear(&p, o.z + 2, q, limits.dt, &o.j, &linwork));
    CALL(arm_errors(&p, &b, limits.dt, 1, q, &(roln_errors){&o.error, o.joints, o.windows}, &train.errors));
    CALL(arm_variance(&p, &b, &o.var, &train.variance));
    CALL(arm_fit_inertia(&o.p, &b, &train.fit_inertia));
    CALL(arm_force_variance(&p, &b, o.forces, &train.force_variance));
    CALL(arm_grad(&p, &weights, &b, limits.dt, &o.g1, &train.grad));
    CALL(arm_grad_acc(&p, &weights, &b, &o.g2, &train.grad_acc));
    CALL(arm_update(&o.p, &opt, &o.o, &o.g1, &train.update));
    CALL(arm_rows(&p, &weights, &b, limits.dt, 0, 0, &o.rows, &train.rows));
    c->faults[0] = arm_tick(&p, &limits, &x, &o.r, o.z, g, &work.tick);
    c->faults[1] = arm_guard_tick(&p, &limits, &x, &at_rest, q, g + 1, &work.guard_tick);
    c->kept = memcmp(&o, &was, sizeof o) == 0;
    call_feedback(c);
    call_filter(c);
}

/* Every function takes the parameters of its model, whatever bytes its scratch began with, and refuses those of another one. */
static void test_params_mismatch(void)
{
    const roln_real slope = p.slope;
    calls c;
    int i, k;
    memset(&work, 0x5b, sizeof work), memset(&train, 0x5b, sizeof train);
    for (k = 0; k < 3; k++) {
        p.slope = k == 1 ? slope / 2 : slope;
        call_all(&c);
        CHECK(c.count == 28 && c.kept == (k == 1));
        for (i = 0; i < c.count; i++)
            CHECK(c.st[i] == (k == 1 ? ROLN_E_SHAPE : ROLN_OK));
        for (i = 0; i < 2; i++)
            CHECK(c.faults[i] == (k == 1 ? ROLN_FAULT_STATUS : 0));
        CHECK(c.faults[2] == (k == 1 ? ROLN_FAULT_STATUS : ROLN_FILTER_START));
    }
}

/* A guard without a state; rows of windows and of samples. */
static void test_shell(void)
{
    static arm_residuals rows;
    static const roln_real q[24] = {ROLN_C(0.1)}, qd[24] = {ROLN_C(0.2)};
    const roln_loss unit = {1, 0, 0, 1, 0, 0, 0, 0, 0, 0};
    roln_batch b = {1, 1, 1, NULL, q, qd, NULL, NULL};
    arm_guard g;
    memset(&g, 0, sizeof g);
    CHECK((arm_guard_tick(&p, &limits, &x, NULL, q, &g, &work.guard_tick) & ROLN_FAULT_STATUS) && g.g.valid == 0);
    CHECK(arm_rows(&p, &unit, &b, limits.dt, 0, 0, &rows, &train.rows) != ROLN_E_SHAPE);
    b.qdd = q;
    CHECK(arm_rows(&p, &unit, &b, limits.dt, 0, 0, &rows, &train.rows) != ROLN_E_SHAPE);
}

/* Each status and each bit of a fault has a text of its own that begins with its name; other numbers say that they are unknown. */
static void test_texts(void)
{
    static const char *const bits[] = {"ROLN_FAULT_INPUT", "ROLN_FAULT_STATUS", "ROLN_FAULT_OUTPUT", "ROLN_FAULT_LIMIT",
                                       "ROLN_FAULT_RANGE", "ROLN_FAULT_ENERGY", "ROLN_FAULT_EXPIRED", "ROLN_FAULT_MANIFOLD",
                                       "ROLN_CLIPPED", "ROLN_FILTER_MISSING", "ROLN_FILTER_OUTLIER", "ROLN_FILTER_START",
                                       "ROLN_FILTER_NONE"};
    const char *text;
    uint32_t word;
    int i, k;
    CHECK(strncmp(roln_status_text(ROLN_OK), "ROLN_OK: ", 9) == 0);
    CHECK(strncmp(roln_status_text(ROLN_E_RANGE), "ROLN_E_RANGE: ", 14) == 0);
    CHECK(strncmp(roln_status_text(ROLN_E_CHECKSUM), "ROLN_E_CHECKSUM: ", 17) == 0);
    for (i = 0; i >= ROLN_E_CHECKSUM; i--)
        for (k = i - 1; k >= ROLN_E_CHECKSUM; k--)
            CHECK(strcmp(roln_status_text(i), roln_status_text(k)) != 0);
    CHECK(strcmp(roln_status_text(1), "unknown status") == 0 && strcmp(roln_status_text(-11), "unknown status") == 0);
    CHECK(ROLN_FILTER_NONE == 1u << 12 && ROLN_CLIPPED == 1u << 8);
    for (word = (1u << 13) - 1, i = 0; word; word &= word - 1, i++) {
        text = roln_fault_text(word);
        CHECK(strncmp(text, bits[i], strlen(bits[i])) == 0 && text[strlen(bits[i])] == ':');
    }
    CHECK(i == 13);
    CHECK(strcmp(roln_fault_text(0), "no fault") == 0 && strcmp(roln_fault_text(1u << 13), "unknown fault") == 0);
}

void TEST_NAME(safety)(void)
{
    static arm_start start;
    int i;
    test_check_arm();
    test_check_driven();
#ifndef ROLN_DOUBLE
    test_check_half();
    test_check_bytes();
#endif
    CHECK(slow_crc(9, (const unsigned char *)"123456789") == 0xcbf43926); /* the one that everybody checks */
    CHECK_OK(arm_init(&p, &seed, &start.init));
    for (i = 0; i < arm_n; i++)
        p.z_min[i] = -100, p.z_max[i] = p.zd_max[i] = 100;
    test_interrupt();
    test_params_mismatch();
    test_shell();
    test_texts();
}
