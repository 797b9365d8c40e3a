/* SPDX-License-Identifier: MIT */
/* The noise of a filter from recordings (NAME_fit_noise): what it finds, what it refuses, and what a chart leaves of a joint. */
#define LOADED_CALLS(X)
#define FILTER_CALLS(X) \
    X(encode) X(decode) X(step) X(push) X(lift) X(dynamics) X(reduce) X(control) X(filter_tick) X(fit_noise)
#include "filter.h"

void TEST_NAME(noise)(void);

/* What NAME_fit_noise refuses; nothing is written. */
static void check_fit_refused(int k, const rig *x, const roln_batch *b)
{
    roln_real each[MAXN];
    const instance m = of_model(k);
    const roln_real y = recorded[0];
    roln_noise noise = {.dt = x->noise.dt, .tau = -1, .gate = 5, .lost = 7, .tau_each = each}, was = noise;
    roln_batch bad;
    fill(MAXN, 7, each);
#define KEPT(l) \
    ((l).dt == was.dt && (l).q == was.q && (l).tau == was.tau && (l).gate == was.gate && (l).lost == was.lost && \
     (l).q_each == was.q_each && (l).tau_each == was.tau_each)
#define REFUSED(l, batch, status) \
    CHECK(m.of->fit_noise(&m, &batch, &l, each, NULL, room_of(m.of->scratch.fit_noise)) == (status)); \
    CHECK(all(MAXN, each, 7) && KEPT(l))
    bad = *b, bad.count = 0;
    REFUSED(noise, bad, ROLN_E_LENGTH);
    bad = *b, bad.stride = 2;
    REFUSED(noise, bad, ROLN_E_LENGTH);
    bad = *b, bad.steps = 3;
    REFUSED(noise, bad, ROLN_E_LENGTH);
    CHECK(m.of->fit_noise(&m, b, &noise, NULL, NULL, room_of(m.of->scratch.fit_noise)) == ROLN_E_RANGE && KEPT(noise));
    noise.dt = 0, was = noise;
    REFUSED(noise, *b, ROLN_E_RANGE);
    noise.dt = x->noise.dt, noise.q = -1, was = noise;
    REFUSED(noise, *b, ROLN_E_RANGE);
    noise.q = 0, zd_max[0] = 0, was = noise;
    REFUSED(noise, *b, ROLN_E_RANGE);
    zd_max[0] = 8;
    recorded[0] = (roln_real)NAN;
    REFUSED(noise, *b, ROLN_E_NOT_FINITE);
    recorded[0] = y;
#undef REFUSED
#undef KEPT
}

/* Unknown torques that compare as tau_each says: all alike they are what one deviation is, and its unit counts for nothing. of: the
   noise of encoders that is known, and one deviation. */
static void check_each(int k, const roln_batch *b, const roln_noise *of)
{
    const instance m = of_model(k);
    const int N = N_OF(k);
    roln_noise noise = *of, was;
    roln_real tau_each[2][MAXN], each[MAXN];
    int i;
    noise.tau_each = NULL;
    for (i = 0; i < MAXN; i++)
        tau_each[0][i] = 1, tau_each[1][i] = i % 2 ? ROLN_C(0.5) : 8;
    CHECK_OK(m.of->fit_noise(&m, b, &noise, each, tau_each[0], room_of(m.of->scratch.fit_noise)));
    CHECK(noise.tau_each == tau_each[0] && all(1, &noise.tau, of->tau) && all(N, tau_each[0], of->tau));
    CHECK(N == MAXN || all(1, &tau_each[0][MAXN - 1], 1));
    was = noise, memcpy(tau_each[0], tau_each[1], sizeof tau_each[0]);
    CHECK_OK(m.of->fit_noise(&m, b, &noise, each, tau_each[0], room_of(m.of->scratch.fit_noise)));
    for (i = 0; i < N; i++)
        CHECK(all(1, &tau_each[0][i], tau_each[1][i] * noise.tau));
    for (i = 0; i < MAXN; i++)
        tau_each[1][i] *= 1024;
    CHECK_OK(m.of->fit_noise(&m, b, &was, each, tau_each[1], room_of(m.of->scratch.fit_noise)));
    CHECK(memcmp(tau_each[0], tau_each[1], (size_t)N * sizeof(roln_real)) == 0);
    was = noise, tau_each[1][0] = -1;
    CHECK(m.of->fit_noise(&m, b, &noise, each, tau_each[1], room_of(m.of->scratch.fit_noise)) == ROLN_E_RANGE);
    CHECK(all(1, tau_each[1], -1));
    fill(MAXN, 0, tau_each[1]);
    CHECK(m.of->fit_noise(&m, b, &noise, each, tau_each[1], room_of(m.of->scratch.fit_noise)) == ROLN_E_NOT_FINITE);
    CHECK(all(MAXN, tau_each[1], 0));
    CHECK(noise.tau_each == was.tau_each && all(1, &noise.tau, was.tau));
}

static void test_fit(int k)
{
    static rig x;
    static roln_real each[MAXN];
    const instance m = of_model(k);
    const int N = N_OF(k);
    roln_noise noise, was;
    roln_batch b;
    uint64_t s = 1300 + (uint64_t)k;
    int i;
    if (k == DEEP || k == PUSHED) return; /* J of size 1e3; midpoint does not always converge */
    place(k, &s, 1, &x), x.noise.dt /= 8;
    fill(MAXN, ROLN_C(0.125), x.tau_each), dyadic(F_OF(k), ROLN_C(0.25), &s, x.tau);
    b = record(k, &x, &s);
    check_fit_refused(k, &x, &b);
    memset(&noise, 0, sizeof noise);
    noise.dt = x.noise.dt, noise.gate = 5, noise.lost = 7, noise.tau = -1, noise.tau_each = each;
    CHECK_OK(m.of->fit_noise(&m, &b, &noise, each, NULL, room_of(m.of->scratch.fit_noise)));
    ROOM_KEPT();
    CHECK(noise.q_each == each && noise.tau_each == NULL && noise.lost == 7 && all(1, &noise.gate, 5) && all(1, &noise.q, 0));
    for (i = 0; i < N; i++)
        BOUND("fit_noise: a joint's, factor", fmaxl((ld)(each[i] / x.q_each[i]), (ld)(x.q_each[i] / each[i])), 1.3);
    /* four times the largest half that is as likely as any */
    BOUND("fit_noise: torques / 4 / true", (ld)noise.tau / 4 / 0.125L, 3.25);
    BOUND("fit_noise: true / torques * 4", 0.125L / ((ld)noise.tau / 4), 2);
    if (k != PLAIN) return;
    was = noise;
    noise.q = x.noise.q, noise.q_each = x.q_each;
    fill(MAXN, 7, each);
    CHECK_OK(m.of->fit_noise(&m, &b, &noise, each, NULL, room_of(m.of->scratch.fit_noise)));
    CHECK(noise.q_each == x.q_each && all(MAXN, each, 7)); /* what is known stays */
    BOUND("fit_noise: both, of torques", fmaxl((ld)(noise.tau / was.tau), (ld)(was.tau / noise.tau)), 2.1);
    check_each(k, &b, &noise);
    was = noise;
    for (i = 0; i < RECORDINGS; i++) /* a torque that nothing follows does not count */
        torques[((i + 1) * SAMPLES - 1) * F_OF(k)] = (roln_real)NAN;
    CHECK_OK(m.of->fit_noise(&m, &b, &noise, each, NULL, room_of(m.of->scratch.fit_noise)));
    CHECK(all(1, &noise.tau, was.tau));
    recorded[N + 1] = recorded[3 * N] = (roln_real)NAN; /* dropped */
    noise.q_each = NULL, noise.q = 0;
    CHECK_OK(m.of->fit_noise(&m, &b, &noise, each, NULL, room_of(m.of->scratch.fit_noise)));
    BOUND("fit_noise: some missing, of torques", fmaxl((ld)(noise.tau / was.tau), (ld)(was.tau / noise.tau)), 2.1);
}

/* What the chart leaves of a joint is in its deviation: q_each^2 = noise^2 + mean (q - phi(rho(q)))^2. A loop that is closed over
   the filter with these settings, gate 0, comes to rest without a fault. */
static void test_fit_chart(void)
{
    enum { LOOP = 2000, SETTLED = 1500, k = POLE };
    static rig x;
    static roln_real each[2][MAXN];
    const instance m = of_model(POLE);
    const int N = N_OF(POLE), samples = RECORDINGS * SAMPLES;
    const roln_real still[MAXN] = {0}, gains[2] = {40, 12}, ref[1] = {ROLN_C(0.19634954)};
    const target_at target = {ref, still, still, gains, gains + 1, NULL};
    roln_noise noise = {.dt = dt / 32}, first = noise;
    roln_real z[MAXN], zd[MAXN], r[MAXN], rd[MAXN], tau[MAXN] = {0}, tau_z[MAXN];
    uint64_t s = 1341;
    uint32_t faults = 0;
    ld left[MAXN] = {0}, far = 0, fast = 0;
    roln_batch b;
    int t, i;
    place(POLE, &s, 1, &x), x.noise.dt = dt / 32;
    fill(2 * N, ROLN_C(0.57735027), theta_k); /* Phi, Psi: each joint counts alike */
    dyadic(F_OF(POLE), ROLN_C(0.25), &s, x.tau);
    b = record(POLE, &x, &s);
    CHECK_OK(m.of->fit_noise(&m, &b, &first, each[0], NULL, room_of(m.of->scratch.fit_noise)));
    for (t = 0; t < samples; t++) { /* the model is linear: what is added alone leaves as much as beside all else */
        roln_real d[MAXN] = {0};
        d[2] = ROLN_C(0.0625) * (roln_real)sin(0.05 * t);
        recorded[t * N + 2] += d[2];
        CHECK_OK(m.of->encode(&m, d, still, z, zd, ROOM(encode)));
        CHECK_OK(m.of->decode(&m, z, zd, r, rd, ROOM(decode)));
        for (i = 0; i < N; i++) { /* the bias of the autoencoder is in neither */
            roln_real r0[MAXN];
            CHECK_OK(m.of->encode(&m, still, still, z, zd, ROOM(encode)));
            CHECK_OK(m.of->decode(&m, z, zd, r0, rd, ROOM(decode)));
            left[i] += (ld)(d[i] - (r[i] - r0[i])) * (ld)(d[i] - (r[i] - r0[i])) / samples;
        }
    }
    CHECK_OK(m.of->fit_noise(&m, &b, &noise, each[1], NULL, room_of(m.of->scratch.fit_noise)));
    for (i = 0; i < N; i++) {
        const ld want = sqrtl((ld)each[0][i] * (ld)each[0][i] + left[i]);
        BOUND("fit_noise: with what the chart leaves, factor", fmaxl((ld)each[1][i] / want, want / (ld)each[1][i]), 1.25);
    }
    memset(&x.e, 0, sizeof x.e), memset(z, 0, sizeof z), memset(zd, 0, sizeof zd);
    for (t = 0; t < LOOP; t++) {
        roln_real y[MAXN];
        CHECK_OK(m.of->decode(&m, z, zd, y, rd, ROOM(decode)));
        y[2] += ROLN_C(0.0625) * (roln_real)sin(80 * (double)z[0]); /* falls there faster than q_2 rises */
        faults |= tick_of(POLE, &noise, y, t > 0 ? tau : NULL, &x.e);
        CHECK_OK(m.of->control(&m, x.e.z, x.e.zd, &target, tau_z, ROOM(control)));
        CHECK_OK(m.of->lift(&m, z, tau_z, tau, ROOM(lift)));
        CHECK_OK(m.of->step(&m, z, zd, tau, noise.dt, ROOM(step)));
        if (t >= SETTLED) far = fmaxl(far, fabsl((ld)z[0] - (ld)ref[0])), fast = fmaxl(fast, fabsl((ld)zd[0]));
    }
    CHECK((faults & ~(uint32_t)ROLN_FILTER_START) == 0);
    BOUND("fit_noise: loop, off its reference", far, 1e-4); /* settings of the noise alone: 0.0095 */
    BOUND("fit_noise: loop, velocity", fast, 4e-4); /* 0.0018 */
}

void TEST_NAME(noise)(void)
{
    int k;
    for (leaps = 0; leaps < 2; leaps++)
        for (k = 0; k < MODELS; k++)
            test_fit(k);
    leaps = 0;
    test_fit_chart();
    print_bounds();
}
