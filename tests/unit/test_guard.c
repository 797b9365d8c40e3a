/* SPDX-License-Identifier: MIT */
/* The guard under fault injection (NAME_guard_tick): every pattern of bits in every number that it reads, limits, rates, holding,
   counters out of order, the manifold, the safe torque. */

#define CALLED(X) X(decode) X(guard_tick)
#include "small.h"
#include "rig.h"

void TEST_NAME(guard)(void);

static uint64_t noise; /* seed of the random patterns */

/* Bit patterns of every class; at >= PATTERNS - 8 they are random. */
enum { PATTERNS = 40 };
static roln_real pattern(int at)
{
#ifdef ROLN_DOUBLE
    static const uint64_t bits[PATTERNS - 8] = {0x0000000000000000u, 0x8000000000000000u, 0x0000000000000001u, 0x8000000000000001u,
                                                0x000fffffffffffffu, 0x800fffffffffffffu, 0x0010000000000000u, 0x8010000000000000u,
                                                0x3ff0000000000000u, 0xbff0000000000000u, 0x7fefffffffffffffu, 0xffefffffffffffffu,
                                                0x7ff0000000000000u, 0xfff0000000000000u, 0x7ff8000000000000u, 0xfff8000000000000u,
                                                0x7ff0000000000001u, 0xfff0000000000001u, 0x7ff7ffffffffffffu, 0xffffffffffffffffu,
                                                0x7fffffffffffffffu, 0x7ff80000deadbeefu, 0x7ff4000000000000u, 0x3cb0000000000000u,
                                                0xbcb0000000000000u, 0x7fe0000000000000u, 0x5fe6a09e667f3bccu, 0xdfe6a09e667f3bccu,
                                                0x1ff0000000000000u, 0x4024000000000000u, 0xc024000000000000u, 0x40590000deadbeefu};
    uint64_t b;
#else
    static const uint32_t bits[PATTERNS - 8] = {0x00000000u, 0x80000000u, 0x00000001u, 0x80000001u, 0x007fffffu, 0x807fffffu,
                                                0x00800000u, 0x80800000u, 0x3f800000u, 0xbf800000u, 0x7f7fffffu, 0xff7fffffu,
                                                0x7f800000u, 0xff800000u, 0x7fc00000u, 0xffc00000u, 0x7f800001u, 0xff800001u,
                                                0x7fbfffffu, 0xffffffffu, 0x7fffffffu, 0x7fc0beefu, 0x7fa00000u, 0x34000000u,
                                                0xb4000000u, 0x7f000000u, 0x5f3504f3u, 0xdf3504f3u, 0x1f800000u, 0x41200000u,
                                                0xc1200000u, 0x42c8beefu};
    uint32_t b;
#endif
    const uint64_t r = roln_rand(&noise);
    roln_real x;
    memcpy(&b, at < PATTERNS - 8 ? (const void *)(bits + at) : (const void *)&r, sizeof b);
    memcpy(&x, &b, sizeof x);
    return x;
}

/* What loggers and bus messages keep: the bits of a fault word do not change. */
static void test_fault_bits(void)
{
    CHECK(ROLN_FAULT_INPUT == 1 && ROLN_FAULT_STATUS == 2 && ROLN_FAULT_OUTPUT == 4 && ROLN_FAULT_LIMIT == 8);
    CHECK(ROLN_FAULT_RANGE == 16 && ROLN_FAULT_ENERGY == 32 && ROLN_FAULT_EXPIRED == 64 && ROLN_FAULT_MANIFOLD == 128);
    CHECK(ROLN_CLIPPED == 256);
}

/* The numbers that a guard reads, by name. */
enum {
    F_Q,
    F_QD,
    F_Z,
    F_ZD,
    F_WANT,
    F_HELD,
    F_MARGIN,
    F_POWER,
    F_TAU,
    F_DT,
    F_ENERGY,
    F_LAST_POWER,
    F_Z_MIN,
    F_Z_MAX,
    F_ZD_MAX,
    FIELDS
};
static const char *const field_names[FIELDS] = {"q",   "qd", "z",      "zd",         "want",  "held",  "margin", "power",
                                                "tau", "dt", "energy", "last power", "z_min", "z_max", "zd_max"};

static roln_real *field_of(rig *x, int field, int i)
{
    roln_real *const at[FIELDS] = {x->q + i,     x->qd + i,         x->z + i,         x->zd + i,      x->want + i,
                                   x->held + i,  &x->limits.margin, &x->limits.residual, &x->limits.tau, &x->limits.dt,
                                   &x->g.energy, &x->g.power,       x->z_min + i,     x->z_max + i,   x->zd_max + i};
    return at[field];
}

static int field_size(int k, int field)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    const int size[FIELDS] = {N, N, n, n, F, F, 1, 1, 1, 1, 1, 1, n, n, n};
    return size[field];
}

/* The faults that a number v in a field must give. */
static uint32_t must_fault(int k, int field, int i, roln_real v, int failed)
{
    const int finite = roln_finite(v), nan = v != v;
    const int sees = failed != ENCODER, angle = i < n_OF(k) && roln_lnn_angle(&models[k]->md->lnn, i);
    switch (field) {
    case F_Q:
    case F_QD: return finite ? 0 : ROLN_FAULT_INPUT;
    case F_Z: return sees && !(ROLN_ABS(v) <= (angle ? ROLN_C(1048576.0) : ROLN_C(1.5))) ? ROLN_FAULT_RANGE : 0;
    case F_ZD: return sees && !(ROLN_ABS(v) <= ROLN_C(2.5)) ? ROLN_FAULT_RANGE : 0;
    case F_WANT:
        if (failed != NOTHING) return 0;
        if (!finite) return ROLN_FAULT_OUTPUT;
        return ROLN_ABS(v) <= ROLN_C(1.5) ? 0 : ROLN_FAULT_LIMIT;
    case F_DT: return finite && v > 0 ? 0 : ROLN_FAULT_INPUT; /* no time passed, or it ran backwards */
    case F_MARGIN:
    case F_POWER:
    case F_TAU: return finite ? 0 : ROLN_FAULT_INPUT; /* a limit that is none limits nothing */
    case F_ENERGY:
    case F_LAST_POWER: return finite || failed != NOTHING ? 0 : ROLN_FAULT_ENERGY;
    case F_Z_MIN:
    case F_Z_MAX: return nan && sees && !angle ? ROLN_FAULT_RANGE : 0;
    case F_ZD_MAX: return nan && sees ? ROLN_FAULT_RANGE : 0;
    default: return 0;
    }
}

/* Mended: good again at the second good tick at the latest (the first may still see the jump in energy), its faults remembered. */
static int recovers(int k, const rig *start, rig *x, uint32_t must)
{
    const roln_guard g = x->g;
    roln_real held[MAXN];
    uint32_t f = 0;
    int after;
    memcpy(held, x->held, sizeof held);
    *x = *start, x->g = g;
    memcpy(x->held, held, sizeof held);
    for (after = 0; after < 2; after++) {
        f = tick(k, x);
        CHECK(within(F_OF(k), x->held, x->limits.tau) && (x->g.faults & must) == must);
        if (after == 0 && f) CHECK(f == ROLN_FAULT_ENERGY);
    }
    return f == 0 && same(F_OF(k), x->held, x->want);
}

/* Every pattern in every number, alone and together with another fault (so that the old torque would be held). */
static void test_guard_patterns(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    int field, i, p, failed;
    good(k, &start);
    for (field = 0; field < FIELDS; field++)
        for (i = 0; i < field_size(k, field); i++)
            for (p = 0; p < PATTERNS; p++)
                for (failed = 0; failed < WAYS_TO_FAIL; failed++) {
                    const roln_real v = pattern(p);
                    const uint32_t must = must_fault(k, field, i, v, failed) | (failed ? ROLN_FAULT_STATUS : 0u);
                    roln_real top;
                    uint32_t f;
                    int ok;
                    x = start, x.failed = failed;
                    *field_of(&x, field, i) = v;
                    top = x.limits.tau >= 0 ? x.limits.tau : 0; /* no torque at all under a limit that is none */
                    f = tick(k, &x);
                    ok = within(F, x.held, top) && (f & must) == must;
                    if (f == 0) ok &= same(F, x.held, x.want);                              /* no fault: what was wanted */
                    if (field <= F_QD && roln_finite(v) && failed == NOTHING) ok &= f == 0; /* any finite measurement is one */
                    if (!CHECK(ok))
                        printf("    model %d, %s[%d] = %g (pattern %d), failed %d: faults %u, torque %g, limit %g\n", k,
                               field_names[field], i, (double)v, p, failed, (unsigned)f, (double)x.held[0], (double)x.limits.tau);
                    if (!CHECK(recovers(k, &start, &x, must)))
                        printf("    model %d, %s[%d] = %g does not recover\n", k, field_names[field], i, (double)v);
                }
    for (failed = 1; failed < WAYS_TO_FAIL; failed++) {
        x = start, x.failed = failed;
        CHECK(tick(k, &x) == ROLN_FAULT_STATUS && within(F, x.held, ROLN_C(1.5)) && same(F, x.held, start.held));
    }
}

/* The torque of the last tick counts if it is as large as the limit allows, and no larger. */
static void test_guard_held(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    int i, sign;
    good(k, &start);
    start.failed = CONTROLLER;
    for (i = 0; i < F; i++)
        for (sign = -1; sign < 2; sign += 2) {
            const roln_real edge = (roln_real)sign * start.limits.tau;
            x = start, x.held[i] = edge;
            CHECK(tick(k, &x) == ROLN_FAULT_STATUS && all(1, x.held + i, edge));
            x = start, x.held[i] = edge * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_STATUS && all(1, x.held + i, 0));
        }
}

/* A balance that is not known, or not finite, is a fault where a limit asks for it, and nothing to compare the next tick with. */
static void test_guard_unknown(int k)
{
    static rig start, x;
    const roln_real huge = PICK(1e30f, 1e290), fast = PICK(1e12f, 1e100);
    const int F = F_OF(k), P = roln_ae_params(&models[k]->md->ae) + rolni_base_at(&models[k]->md->lnn);
    good(k, &start);
    fill(n_OF(k), huge, start.zd_max);
    start.limits.tau = PICK(1e35f, 1e295), start.g.valid = 0;

    x = start, x.zd[0] = huge; /* T overflows */
    fill(F, 0, x.held), fill(F, 0, x.want);
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.valid == 0);
    x.limits.residual = 0;
    CHECK(tick(k, &x) == 0 && x.g.valid == 0);

    x = start, x.zd[0] = fast; /* the power of the torque of the last tick overflows */
    fill(F, huge, x.held), fill(F, 0, x.want);
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.valid == 0);

    x = start, x.zd[0] = fast; /* that of the new torque does */
    fill(F, 0, x.held), fill(F, huge, x.want);
    CHECK(tick(k, &x) == 0 && x.g.valid == 0 && same(F, x.held, x.want));

    if (!models[k]->md->lnn.base) return;
    good(k, &x);
    theta_k[P] = -1; /* no mass matrix */
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.valid == 0);
    x.limits.residual = 0;
    CHECK(tick(k, &x) == 0);
}

/* What z does not see: q, qd off the manifold, in any joint; limits of 0 do not look, limits that are none are a fault. */
static void test_guard_manifold(int k)
{
    static rig start, x;
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    const roln_real off = ROLN_C(0.015625), bad[3] = {-1, (roln_real)NAN, (roln_real)INFINITY};
    int i, side;
    good(k, &start);
    CHECK_OK(m.of->decode(&m, start.z, start.zd, start.q, start.qd, ROOM(decode)));
    start.limits.q_tolerance = off, start.limits.qd_tolerance = 2 * off;
    x = start;
    CHECK(tick(k, &x) == 0);
    for (i = 0; i < N; i++)
        for (side = -1; side < 2; side += 2) {
            const roln_real s = (roln_real)side;
            x = start, x.q[i] += ROLN_C(0.875) * s * off, x.qd[i] += ROLN_C(1.75) * s * off;
            CHECK(tick(k, &x) == 0);
            x = start, x.q[i] += ROLN_C(1.125) * s * off;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x.limits.q_tolerance = 0;
            CHECK(tick(k, &x) == 0);
            x = start, x.limits.residual = ROLN_C(1e9); /* its energy is not known, neither here nor from here to the next tick */
            CHECK(tick(k, &x) == 0 && x.g.valid == 1);
            x.q[i] += ROLN_C(1.125) * s * off;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD && x.g.valid == 0);
            x = start, x.qd[i] += ROLN_C(2.25) * s * off;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x.limits.qd_tolerance = 0;
            CHECK(tick(k, &x) == 0);
            x = start, x.q[i] = s * (roln_real)INFINITY; /* bad numbers are nowhere, not off the manifold */
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
            x = start, x.qd[i] = (roln_real)NAN;
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
        }
    for (i = 0; i < 3; i++) {
        x = start, x.limits.q_tolerance = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
        x = start, x.limits.qd_tolerance = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = F_MARGIN; i <= F_TAU; i++) { /* a negative limit is none */
        x = start;
        *field_of(&x, i, 0) = -1;
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = 0; i < 3; i++) { /* an old torque that is none, under a limit that is none */
        const roln_real none[3] = {(roln_real)INFINITY, -(roln_real)INFINITY, (roln_real)NAN};
        x = start, x.limits.tau = (roln_real)INFINITY;
        x.held[F_OF(k) - 1] = none[i];
        CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && within(F_OF(k), x.held, x.limits.residual));
    }
    x = start, x.z[n - 1] = (roln_real)NAN;
    CHECK((tick(k, &x) & (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE)) == (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE));
}

/* Counters out of order: whatever bad, known, faults and hold are, the torque is safe and a corrupted count does not hold for
   ever. */
static void test_guard_counters(int k)
{
    static const int counts[9] = {-2147483647 - 1, -2147483647, -1, 0, 1, 4, 1000, 2147483646, 2147483647};
    const int F = F_OF(k);
    static rig start, x;
    int b, h, t;
    good(k, &start);
    for (b = 0; b < 9; b++)
        for (h = 0; h < 9; h++) {
            x = start, x.g.bad = counts[b], x.limits.hold = counts[h], x.g.valid = counts[(b + h) % 9];
            x.failed = CONTROLLER;
            for (t = 0; t < 4; t++) {
                const uint32_t f = tick(k, &x);
                CHECK((f & ROLN_FAULT_STATUS) && within(F, x.held, x.limits.tau));
                CHECK(((f & ROLN_FAULT_INPUT) != 0) == (counts[h] < 0));
                if (counts[h] <= 0 || counts[b] < 0) CHECK(f & ROLN_FAULT_EXPIRED); /* no holding; a count below zero is none */
            }
        }
    for (b = 0; b < 128; b++) { /* any fault word: EXPIRED stays, the others do not matter */
        x = start, x.g.faults = (uint32_t)b;
        CHECK(tick(k, &x) == ((uint32_t)b & ROLN_FAULT_EXPIRED) && x.g.faults == (uint32_t)b);
    }
}

/* A bad torque is held for exactly `hold` ticks; then it is too late until guard.g is zeroed. */
static void check_hold(int k, const rig *start, int hold)
{
    const int F = F_OF(k);
    static rig x;
    roln_real last[MAXN];
    int t;
    x = *start, x.limits.hold = hold;
    memcpy(last, x.held, sizeof last);
    for (t = 1; t <= hold + 3; t++) {
        const uint32_t expired = t > hold ? ROLN_FAULT_EXPIRED : 0;
        x.want[0] = (roln_real)NAN;
        CHECK(tick(k, &x) == (ROLN_FAULT_OUTPUT | expired));
        CHECK(expired ? all(F, x.held, 0) : same(F, x.held, last));
    }
    x.want[0] = last[0];
    for (t = 0; t < 5; t++)
        CHECK((tick(k, &x) & ~(uint32_t)ROLN_FAULT_ENERGY) == ROLN_FAULT_EXPIRED && all(F, x.held, 0));
    CHECK((x.g.faults & ~(uint32_t)ROLN_FAULT_ENERGY) == (ROLN_FAULT_OUTPUT | ROLN_FAULT_EXPIRED));
    memset(&x.g, 0, sizeof x.g);
    CHECK(tick(k, &x) == 0 && same(F, x.held, x.want) && x.g.faults == 0);
}

/* Makes one of five things wrong, or none; the fault that it is. */
static uint32_t go_wrong(int k, int what, int F, rig *x)
{
    switch (what) {
    case 0: x->qd[0] = (roln_real)INFINITY; return ROLN_FAULT_INPUT;
    case 1: x->failed = CONTROLLER; return ROLN_FAULT_STATUS;
    case 2: x->want[F - 1] = (roln_real)NAN; return ROLN_FAULT_OUTPUT;
    case 3: x->want[0] = ROLN_C(-1.5) * (1 + 2 * ROLN_EPS); return ROLN_FAULT_LIMIT;
    case 4: x->z[bounded(k)] = 3; return ROLN_FAULT_RANGE;
    case 5: x->failed = ENCODER; return ROLN_FAULT_STATUS;
    default: return 0;
    }
}

/* Random good and bad ticks against a counter. */
static void test_guard_hold(int k)
{
    const int F = F_OF(k);
    static rig start, x;
    roln_real last[MAXN];
    uint64_t s = 310 + (uint64_t)k;
    int hold, t, i, run, bad, over;
    good(k, &start);
    for (hold = 0; hold <= 5; hold++)
        check_hold(k, &start, hold);
    for (run = 0; run < 200; run++) {
        x = start, x.limits.residual = run % 2 ? 0 : start.limits.residual, x.limits.hold = roln_randint(4, &s);
        memcpy(last, x.held, sizeof last);
        for (bad = over = 0, t = 0; t < 40; t++) {
            uint32_t want;
            memcpy(x.z, start.z, sizeof x.z), memcpy(x.qd, start.qd, sizeof x.qd), x.failed = NOTHING;
            for (i = 0; i < F; i++)
                x.want[i] = start.held[i] * (1 + (roln_real)(t % 3) / 64);
            want = go_wrong(k, roln_randint(12, &s), F, &x);
            bad = want || over ? bad + 1 : 0;
            over |= bad > x.limits.hold;
            for (i = 0; i < F && !want; i++)
                last[i] = x.want[i];
            if (over) want |= ROLN_FAULT_EXPIRED;
            CHECK(tick(k, &x) == want);
            CHECK(over ? all(F, x.held, 0) : same(F, last, x.held));
        }
    }
}

/* Margins: the edge is in, the next number is out. */
static void test_guard_range(int k)
{
    const int n = n_OF(k);
    static rig start, x;
    int i, side;
    good(k, &start);
    start.limits.residual = 0, start.g.valid = 0;
    for (i = 0; i < n; i++)
        for (side = 0; side < 4; side++) {
            const int angle = side < 2 && roln_lnn_angle(&models[k]->md->lnn, i);
            const roln_real sign = side % 2 ? 1 : -1, edge = angle ? ROLN_C(1048576.0) : side < 2 ? ROLN_C(1.5) : ROLN_C(2.5);
            x = start;
            (side < 2 ? x.z : x.zd)[i] = sign * edge;
            CHECK(tick(k, &x) == 0);
            (side < 2 ? x.z : x.zd)[i] = sign * edge * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_RANGE);
            x = start, x.want[0] = sign * x.limits.tau;
            CHECK(tick(k, &x) == 0);
            x.want[0] = sign * x.limits.tau * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_LIMIT);
        }
}

/* One number for every joint, or each its own: what a torque is clipped to, as a fault where limits are strict. */
static void test_guard_clip(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, own, sign;
    good(k, &start);
    start.limits.strict = 0;
    for (i = 0; i < F; i++)
        each[i] = ROLN_C(1.25) + (roln_real)i / 64, rates[i] = 2 + (roln_real)i;
    for (own = 0; own < 2; own++)
        for (i = 0; i < F; i++)
            for (sign = -1; sign < 2; sign += 2) {
                const roln_real s = (roln_real)sign, top = own ? each[i] : start.limits.tau;
                const roln_real last = start.held[i], step = s * (own ? rates[i] : 2) * start.limits.dt;
                roln_real want[MAXN];
                x = start;
                if (own) x.limits.tau_each = each, x.limits.tau = 0; /* tau is not read */
                memcpy(want, x.want, sizeof want);
                x.want[i] = want[i] = s * top; /* the edge is in */
                CHECK(tick(k, &x) == 0 && same(F, x.held, want));
                x.want[i] = s * top * (1 + ROLN_EPS);
                CHECK(tick(k, &x) == ROLN_CLIPPED && same(F, x.held, want) && x.g.bad == 0 && x.g.valid);
                x.want[i] = s * PICK(1e38f, 1e300);
                CHECK(tick(k, &x) == ROLN_CLIPPED && same(F, x.held, want));
                x.failed = CONTROLLER; /* what is not applied is not clipped; what was clipped may be held */
                CHECK(tick(k, &x) == ROLN_FAULT_STATUS && same(F, x.held, want));
                x.failed = NOTHING, x.limits.strict = 1;
                CHECK(tick(k, &x) == ROLN_FAULT_LIMIT && same(F, x.held, want));
                x = start, x.z[bounded(k)] = 3, x.want[i] = 2 * s; /* another fault: nothing is clipped, the last torque is held */
                CHECK(tick(k, &x) == ROLN_FAULT_RANGE && same(F, x.held, start.held));
                x = start, x.limits.rate = own ? 0 : 2; /* by its rate: once, and once more; then it is there */
                if (own) x.limits.rate_each = rates;
                x.want[i] = last + ROLN_C(1.5) * step;
                CHECK(tick(k, &x) == ROLN_CLIPPED && all(1, x.held + i, last + step) && x.g.bad == 0);
                x.held[i] = x.want[i] = last;
                CHECK(tick(k, &x) == 0 && same(F, x.held, start.held));
                x.want[i] = last + ROLN_C(1.5) * step, x.limits.strict = 1;
                CHECK(tick(k, &x) == ROLN_FAULT_LIMIT && same(F, x.held, start.held));
            }
    x = start, x.limits.rate = 8; /* from nothing, half a unit a tick */
    memset(&x.g, 0, sizeof x.g);
    fill(F, 0, x.held), fill(F, ROLN_C(1.25), x.want);
    CHECK(tick(k, &x) == ROLN_CLIPPED && all(F, x.held, ROLN_C(0.5)));
    CHECK(tick(k, &x) == ROLN_CLIPPED && all(F, x.held, 1));
    CHECK(tick(k, &x) == 0 && all(F, x.held, ROLN_C(1.25)) && x.g.faults == ROLN_CLIPPED);
}

/* Whatever is wanted, and whatever the last torque was: within the limits of torque, and of rate after one that was, too. */
static void test_guard_clip_patterns(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, p, r;
    good(k, &start);
    for (i = 0; i < F; i++)
        each[i] = ROLN_C(1.25) + (roln_real)i / 64, rates[i] = (roln_real)i;
    start.limits.strict = 0, start.limits.residual = 0, start.limits.tau_each = each, start.limits.rate_each = rates;
    for (i = 0; i < F; i++)
        for (p = 0; p < PATTERNS; p++)
            for (r = 0; r < PATTERNS; r++) {
                const roln_real want = pattern(p), held = pattern(r);
                const roln_real last = ROLN_ABS(held) <= each[i] ? held : 0, step = rates[i] * start.limits.dt;
                uint32_t f;
                x = start, x.want[i] = want, x.held[i] = held;
                f = tick(k, &x);
                CHECK(roln_finite(x.held[i]) && ROLN_ABS(x.held[i]) <= each[i]);
                CHECK(i == 0 || ROLN_ABS(x.held[i] - last) <= step + 4 * ROLN_EPS); /* 0: no bound of the rate */
                if (!roln_finite(want)) CHECK(f == ROLN_FAULT_OUTPUT);
                else CHECK(f == (all(1, x.held + i, want) ? 0 : (uint32_t)ROLN_CLIPPED));
            }
}

/* Limits of single joints, rates and windows that are none. */
static void test_guard_limits(int k)
{
    const roln_real bad[3] = {-1, (roln_real)NAN, (roln_real)INFINITY};
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, b;
    good(k, &start);
    fill(MAXN, 2, each), fill(MAXN, 100, rates);
    start.limits.tau_each = each, start.limits.rate_each = rates;
    x = start;
    CHECK(tick(k, &x) == 0);
    for (b = 0; b < 3; b++) {
        for (i = 0; i < F; i++) {
            x = start, each[i] = bad[b];
            CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && within(F, x.held, 2) && (b == 2 || all(1, x.held + i, 0)));
            each[i] = 2, rates[i] = bad[b];
            x = start;
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT && same(F, x.held, start.held));
            rates[i] = 100;
        }
        x = start, x.limits.rate_each = NULL, x.limits.rate = bad[b];
        CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
    }
    x = start, x.limits.residual_window = -1;
    CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
    x = start, x.limits.tau_each = NULL, x.limits.tau = -1; /* nothing at all under a limit that is none */
    CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && all(F, x.held, 0));
}

/* Once expired, the torque is the user's, within the limit, and 0 where that is no number. Held torques are as before. */
static void test_guard_safe(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real safe[MAXN], clipped[MAXN];
    uint32_t flipped;
    int t, p, i;
    good(k, &start);
    for (i = 0; i < F; i++)
        safe[i] = (roln_real)(i + 1) / 16;
    start.limits.safe = safe, start.limits.rate = 1, start.failed = CONTROLLER;
    for (t = 1; t <= 3; t++)
        CHECK(tick(k, &start) == ROLN_FAULT_STATUS && same(F, start.held, start.want));
    for (p = 0; p < PATTERNS; p++) { /* at once, in spite of the rate; and it may change from tick to tick */
        const roln_real v = pattern(p);
        memcpy(clipped, safe, sizeof clipped);
        clipped[F - 1] = !roln_finite(v) ? 0 : v < ROLN_C(-1.5) ? ROLN_C(-1.5) : v > ROLN_C(1.5) ? ROLN_C(1.5) : v;
        x = start, safe[F - 1] = v;
        x.failed = p % WAYS_TO_FAIL;
        x.g.faults |= ROLN_FAULT_EXPIRED; /* as somebody may who stops it from outside */
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, clipped));
        safe[F - 1] = clipped[F - 1] = ROLN_C(0.125);
        x.failed = NOTHING;
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, clipped));
        x.limits.tau = (roln_real)NAN;
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && all(F, x.held, 0));
    }
    x = start;
    CHECK(tick(k, &x) == (ROLN_FAULT_STATUS | ROLN_FAULT_EXPIRED) && same(F, x.held, safe));
    start = x, start.failed = NOTHING;
    for (p = 0; p < 64; p++) { /* a bit that flips in the count or in the faults does not arm the motors */
        x = start;
        if (p < 32) x.g.faults ^= (uint32_t)1 << p;
        else {
            memcpy(&flipped, &x.g.bad, sizeof flipped);
            flipped ^= (uint32_t)1 << (p - 32);
            memcpy(&x.g.bad, &flipped, sizeof flipped);
        }
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, safe));
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, safe) && x.g.bad == -1);
    }
}

void TEST_NAME(guard)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_guard_patterns(k);
        test_guard_held(k);
        test_guard_unknown(k);
        test_guard_manifold(k);
        test_guard_counters(k);
        test_guard_hold(k);
        test_guard_range(k);
        test_guard_clip(k);
        test_guard_clip_patterns(k);
        test_guard_limits(k);
        test_guard_safe(k);
    }
    test_fault_bits();
    print_bounds();
}
