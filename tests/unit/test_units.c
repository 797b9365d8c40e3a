/* SPDX-License-Identifier: MIT */
/* Joints with units of their own (ROLN_SCALE each): where these are powers of two, every function of prediction gives the bits
   that it gives for joints that were scaled by hand. How they are kept and refused. */

#define CALLED(X) \
    X(encode) X(encode_reference) X(decode) X(lift) X(inertia) X(gains) X(allocate) X(reduce) X(step) X(linear)
/* The small models with joints in units of their own. */
#define SMALL(name) name##_own
#define SMALL_SCALE each
#include "small_models.h"

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
#define ROLN_QUANTISE int8
#include "roln.h"
#endif

#include "small.h"
#include "units.h"

void TEST_NAME(units)(void);

static void test_states(int k)
{
    static pair p;
    roln_real x[3 * MAXN], X[3 * MAXN], z[2][3 * MAXN], y[2][2 * MAXN], at[MAXN];
    uint64_t s = 10 + (uint64_t)k;
    int i, N;
    pair_of(k, &s, &p), N = p.N;
    dyadic(3 * N, 1, &s, x), in_units(&p, 1, 3, x, X);
    for (i = 0; i < 2; i++) {
        const roln_real *a = i ? X : x;
        const instance *m = i ? &p.own : &p.plain;
        fill(3 * MAXN, 7, z[i]);
        CHECK_OK(m->of->encode(m, a, a + N, z[i], z[i] + p.n, ROOM(encode)));
    }
    CHECK(same(3 * MAXN, z[0], z[1]));
    for (i = 0; i < 2; i++) { /* without an acceleration, with one */
        fill(3 * MAXN, 7, z[0]), fill(3 * MAXN, 7, z[1]);
        CHECK_OK(p.plain.of->encode_reference(&p.plain, x, x + N, i ? x + 2 * N : NULL, z[0], z[0] + p.n, z[0] + 2 * p.n,
                                              ROOM(encode_reference)));
        CHECK_OK(p.own.of->encode_reference(&p.own, X, X + N, i ? X + 2 * N : NULL, z[1], z[1] + p.n, z[1] + 2 * p.n,
                                            ROOM(encode_reference)));
        CHECK(same(3 * MAXN, z[0], z[1]));
    }
    CHECK_OK(p.plain.of->decode(&p.plain, z[0], z[0] + p.n, y[0], y[0] + N, ROOM(decode)));
    CHECK_OK(p.own.of->decode(&p.own, z[0], z[0] + p.n, y[1], y[1] + N, ROOM(decode)));
    in_units(&p, 1, 2, y[0], y[0]);
    CHECK(same(2 * N, y[0], y[1]));
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
    const int k = p->k, count = p->inputs > 0 ? 0 : ROLN_MIN(3, p->N);
    const roln_motors plain = {.count = count, .B = count > 0 ? B[0] : NULL, .mu = ROLN_C(0.5)};
    const roln_motors own = {.count = count, .B = count > 0 ? B[1] : NULL, .mu = ROLN_C(0.5)};
    int i;
    dyadic(3 * MAXN, 1, s, B[0]);
    for (i = 0; i < p->N * count; i++)
        B[1][i] = B[0][i] / p->each[i / count];
    CHECK_OK(p->plain.of->allocate(&p->plain, z, &plain, z + p->n, u[0], missed, ROOM(allocate)));
    CHECK_OK(p->own.of->allocate(&p->own, z, &own, z + p->n, u[1], missed + 1, ROOM(allocate)));
    CHECK(same(count > 0 ? count : p->inputs, u[0], u[1]) && same(1, missed, missed + 1) && missed[0] > 0);
}

static void test_forces(int k)
{
    static pair p;
    static roln_real A[2][256], B[2][512];
    roln_real z[2][2 * MAXN], tau[2][MAXN], y[2][MAXN], s0[2 * MAXN];
    uint64_t s = 20 + (uint64_t)k;
    const int empty = models[k]->md->ae.layers > 0 ? 0 : 3; /* arrays of length 0, which C has not, are of one number */
    int i, j, n, F;
    pair_of(k, &s, &p), n = p.n, F = p.F;
    dyadic(2 * n, ROLN_C(0.5), &s, s0), dyadic(F, 1, &s, tau[0]), force_in_units(&p, 1, tau[0], tau[1]);
    CHECK_OK(p.plain.of->reduce(&p.plain, s0, tau[0], y[0], ROOM(reduce)));
    ROOM_KEPT();
    CHECK_OK(p.own.of->reduce(&p.own, s0, tau[1], y[1], room_of(with_own[k]->scratch.reduce)));
    ROOM_KEPT();
    CHECK_BELOW(room_end - 2 - empty, room_used()); /* of its own units, too, no more than it takes */
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
            B[0][j] *= p.inputs > 0 ? 1 : p.each[j % F];
        CHECK(same(2 * n * F, B[0], B[1]) && largest(2 * n * F, B[0]) > 0);
    }
    fill(MAXN, 7, y[0]), y[1][0] = (roln_real)NAN; /* of a force that is not finite */
    memcpy(y[1] + 1, tau[1] + 1, (size_t)(F - 1) * sizeof *tau[1]);
    CHECK(p.own.of->reduce(&p.own, s0, y[1], y[0], spare) == ROLN_E_NOT_FINITE && all(MAXN, y[0], 7));
    check_motors(&p, s0, &s);
}

/* ---- kept and refused ------------------------------------------------------------------------- */

static void nothing(void *ctx, const char *piece)
{
    *(int *)ctx += (int)strlen(piece);
}

/* Units of angles are 1: else the numbers are of another model. */
static void test_params_mismatch(void)
{
    static wheel_own_params p, back;
    static wheel_own_start start;
    static wheel_own_work work;
    static unsigned char bytes[wheel_own_packed_size], plain[wheel_packed_size];
    static wheel_params other;
    const wheel_own_state x = {{0}, {0}};
    wheel_own_latent z = {{7}, {7}};
    roln_check c = {0, 0, 0, 0};
    uint64_t s = 3;
    int i, written = 0;
    CHECK_OK(wheel_own_init(&p, &s, &start.init));
    p.each[1] = ROLN_C(0.3);
    CHECK(!wheel_own_params_mismatch(&p) && (int)wheel_own_numbers == (int)wheel_numbers + 3);
    wheel_own_pack(&p, bytes);
    CHECK(wheel_own_unpack(wheel_own_packed_size, bytes, &back) == ROLN_OK && memcmp(&p, &back, sizeof p) == 0);
    memcpy(plain, bytes, sizeof plain);
    CHECK(wheel_unpack(wheel_packed_size, plain, &other) == ROLN_E_SHAPE);
    memset(&other, 0, sizeof other), wheel_pack(&other, plain), memcpy(bytes, plain, sizeof plain);
    CHECK(wheel_own_unpack(wheel_own_packed_size, bytes, &back) == ROLN_E_SHAPE);
    CHECK(wheel_own_check(&p, wheel_own_numbers, &c) == ROLN_OK);
    p.each[1] *= 2; /* a part of what is checked */
    CHECK(wheel_own_check(&p, wheel_own_numbers, &c) == ROLN_E_CHECKSUM);
    for (i = 0; i < 3; i += 2) {
        p.each[i] = ROLN_C(0.5);
        CHECK(wheel_own_params_mismatch(&p) && wheel_own_encode(&p, &x, &z, &work.encode) == ROLN_E_SHAPE && all(1, z.z, 7));
        CHECK(wheel_own_write(&p, nothing, &written) == ROLN_E_SHAPE && written == 0);
        wheel_own_pack(&p, bytes);
        CHECK(wheel_own_unpack(wheel_own_packed_size, bytes, &back) == ROLN_E_SHAPE);
        p.each[i] = 1;
    }
    CHECK(!wheel_own_params_mismatch(&p) && wheel_own_write(&p, nothing, &written) == ROLN_OK && written > 0);
}

#ifndef ROLN_DOUBLE
/* Weights stored small keep the units. */
static void test_store(void)
{
    static geared_params p;
    static geared8_params a;
    static geared_start start;
    static geared_train train;
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
    CHECK_OK(geared_fit_range(&p, 4, q, qd, &train.fit_range));
    p.dt = dt;
    geared_pack(&p, bytes);
    CHECK_OK(geared8_quantise(geared_packed_size, bytes, &a, &store.quantise));
    CHECK(same(6, a.each, p.each) && same(1, &a.dt, &p.dt) && memcmp(&a.scale, &p.scale, sizeof a.scale) == 0);
    CHECK(same(2, a.z_min, p.z_min) && same(2, a.z_max, p.z_max) && same(2, a.zd_max, p.zd_max));
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    CHECK_OK(geared_encode(&p, &x, &z, &work.encode));
    memcpy(&z8, &z, sizeof z8);
    CHECK_OK(geared_decode(&p, &z, &y, &work.decode));
    CHECK_OK(geared8_decode(&a, &z8, &y8, &work8.decode));
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
    }
    test_params_mismatch();
#ifndef ROLN_DOUBLE
    test_store();
#endif
    print_bounds();
}
