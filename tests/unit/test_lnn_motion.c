/* SPDX-License-Identifier: MIT */
/* Motion of a Lagrangian network (roln_lnn.h): what must hold whatever the weights are. The order of the integrators, the energy
   over 10,000 steps, its rate, damping and dry friction, whole turns of an angle, the momentum of an ignorable coordinate. */
#include "roln_lnn.h"
#include "network.h"

void TEST_NAME(lnn_motion)(void);

/* Order of the integrators against the twin's RK4 with many steps. */
static void test_order(uint64_t *seed)
{
#ifdef ROLN_DOUBLE
    static const double order[5] = {0, 1, 4, 2, 1};
    int scheme, q, k, i, which;
    for (which = 0; which < 2; which++) {
        const roln_lnn f = which ? damped(behind(shape(2, 0, 3, 3, 2), 1)) : shape(2, 1, 3, 5, 4);
        roln_real *th = weights(&f, seed), *s0 = normal(4, 0.7, seed), *tape = fresh(TAPE(1, 0, 1));
        const roln_system sys = {th, NULL};
        const double T = 0.8;
        ld ref[4];
        m.force = 0;
        widen(4, s0, ref);
        for (k = 0; k < 200; k++) t_step(ROLN_RK4, (ld)T / 200, ref, ref);
        for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) {
            roln_real *w = fresh(ROLN_LNN_STEP_WORK(SZ, scheme, 0, 1));
            double e[3];
            for (q = 0; q < 3; q++) {
                const int steps = (order[scheme] < 2 ? 64 : 8) << q;
                double s[4];
                memcpy(s, s0, sizeof s);
                for (k = 0; k < steps; k++) CHECK(roln_lnn_step(&f, &sys, scheme, 0, 1, T / steps, s, s, tape, w) == ROLN_OK);
                for (e[q] = 0, i = 0; i < 4; i++) e[q] += fabs(s[i] - (double)ref[i]);
            }
            CHECK_NEAR(log(e[0] / e[1]) / log(2), order[scheme], 0.15);
            CHECK_NEAR(log(e[1] / e[2]) / log(2), order[scheme], 0.1);
        }
        fresh_done();
    }
#else
    (void)seed;
#endif
}

/* The friction d = R zd, at s. */
static void friction(const roln_lnn *f, const roln_real *th, const roln_real *s, roln_real *d, roln_real *tape, roln_real *w)
{
    roln_dynamics_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    out.d = d;
    CHECK(roln_lnn_dynamics(f, th, s, &out, tape, w) == ROLN_OK);
}

static void test_energy(uint64_t *seed)
{
    int which, k;
    for (which = 0; which < 4; which++) {
        const roln_lnn f = which == 0   ? shape(2, 1, 2, 4, 0)
                           : which == 1 ? behind(shape(2, 1, 2, 4, 0), 2)
                           : which == 2 ? cholesky(shape(2, 0, 2, 4, 0))
                                        : damped(behind(shape(2, 0, 2, 4, 0), 1));
        roln_real *th = bowl(&f, seed), *s = fresh(4), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
        const roln_system sys = {th, NULL};
        const int steps = which == 0 ? 10000 : 4000;
        double e0, e, last = 0, mean[2] = {0, 0}, swing = 0, rise = 0;
        s[0] = ROLN_C(0.6), s[1] = ROLN_C(-0.3), s[2] = ROLN_C(0.2), s[3] = ROLN_C(0.5);
        e0 = energy(&f, th, s, tape, w);
        for (k = 0; k < steps; k++) {
            CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, ROLN_C(0.05), s, s, tape, w) == ROLN_OK);
            e = energy(&f, th, s, tape, w) - e0;
            mean[2 * k / steps] += 2 * e / steps;
            swing = fabs(e) > swing ? fabs(e) : swing;
            rise = e - last > rise ? e - last : rise;
            last = e;
        }
        if (f.damping) { /* never rises but by the error of the step, h^3, and comes to rest at the bottom, 2 n log 2 */
            BOUND("damped midpoint: rise of the energy in a step", (ld)(rise / e0), 1e-5L);
            BOUND("damped midpoint: energy left", (ld)((e0 + last) / (4 * log(2)) - 1), 1e-3L);
            CHECK(e0 + last > 0.999 * 4 * log(2));
        } else {
            const ld drift = (ld)(fabs(mean[1] - mean[0]) / e0); /* of the mean of each half */
            BOUND("midpoint: energy over 10^4 steps", (ld)(swing / e0), 3e-4L);
            BOUND("midpoint: drift of the energy", drift, sizeof(roln_real) == 4 ? 2e-5L : which ? 1e-5L : 1e-6L);
        }
        fresh_done();
    }
}

/* dE/dt = zd . (tau - d) along the flow: E after and before a short RK4 step under a constant force. */
static void test_power(uint64_t *seed)
{
    int rep;
    for (rep = 0; rep < 8 + 2 * VARIANTS; rep++) {
        roln_lnn f = rep < 6 ? shape(3, rep % 2, 3, 6, 5) : rep < 26 ? variant(rep % VARIANTS) : variant(rep - 26 + GROWING);
        const int n = f.n;
        roln_real *th = weights(&f, seed);
        const inputs x = draw(&f, th, ZDD, 1, 0, seed);
        roln_real *a = fresh(2 * n), *d = fresh(n), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
        const roln_real h = sizeof(roln_real) == 8 ? ROLN_C(1e-3) : ROLN_C(2e-2);
        double e[2], power = 0, size = 0;
        roln_force fc;
        roln_system sys;
        int q, i;
        fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = x.a[0], fc.jac_zd = NULL;
        sys.theta = th, sys.force = &fc;
        for (q = 0; q < 2; q++) {
            CHECK(roln_lnn_step(&f, &sys, ROLN_RK4, 0, 1, q ? h : -h, x.s, a, tape, w) == ROLN_OK);
            e[q] = energy(&f, th, a, tape, w);
        }
        friction(&f, th, x.s, d, tape, w);
        for (i = 0; i < n; i++) {
            const double watt = (double)x.s[n + i] * ((double)x.a[0][i] - (double)d[i]);
            power += watt, size += fabs(watt);
        }
        power -= (e[1] - e[0]) / (2 * (double)h);
        BOUND("dE/dt = zd . (tau - d)", (ld)(fabs(power) / (1 + size)), sizeof(roln_real) == 8 ? 1e-5L : 4e-3L);
        fresh_done();
    }
}

/* zd^T d = |L^T zd|^2 >= 0, but for the rounding of the sum, whatever the weights. */
static void test_damping(uint64_t *seed)
{
    int rep, i, j;
    for (rep = 0; rep < 3000; rep++) {
        const int n = 1 + rep % 5;
        const roln_lnn f = damped(rep % 3 ? shape(n, 0, 2, 2, 0) : cholesky(shape(n, 0, 2, 2, 0)));
        roln_real *th = weights(&f, seed), *s = normal(2 * n, 1, seed), *d = fresh(n);
        roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(TERMS_WORK);
        ld u[ROLN_TRI(MAXN)], L[MAXN * MAXN], x[2 * MAXN], power = 0, size = 0, y, scale = (ld)roln_normal(seed);
        for (i = damper_at; i < base_at; i++) th[i] = (roln_real)(10 * scale * scale * (ld)th[i]); /* from nothing to strong */
        for (i = base_at - n; rep % 7 == 0 && i < base_at; i++) th[i] = 0;
        widen(roln_lnn_params(&f), th, m.th), widen(2 * n, s, x);
        friction(&f, th, s, d, tape, w);
        t_mlp(&f.damper_net, m.th + damper_at, x, u);
        t_low(n, u, 0, L);
        for (j = 0; j < n; j++) {
            for (y = 0, i = 0; i < n; i++) y += L[i * n + j] * x[n + i];
            for (i = 0; i < n; i++) size += fabsl(x[n + i] * L[i * n + j] * y);
        }
        for (i = 0; i < n; i++) power += x[n + i] * (ld)d[i];
        BOUND("damping: -zd . d (eps)", -power / (EPS * (size + 1e-9L)), 8);
        fresh_done();
    }
}

/* Dry friction is c tanh(zd / v), takes power whatever c and v are, at every velocity, and begins with e^-2. */
static void test_rubbing(uint64_t *seed)
{
    int rep, i;
    for (rep = 0; rep < 1000; rep++) {
        const int n = 1 + rep % 5;
        const roln_lnn f = rubbing(rep % 2 ? shape(n, 0, 2, 2, 0) : damped(cholesky(shape(n, 0, 2, 2, 0))));
        roln_real *th = weights(&f, seed), *s = normal(2 * n, pow(10, rep % 9 - 4), seed), *d = fresh(n), *smooth = fresh(n);
        roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(TERMS_WORK);
        if (rep < 20) {
            roln_lnn_init(&f, th, seed);
            for (i = friction_at; i < base_at; i++) CHECK_NEAR(th[i], -2, 0);
        }
        for (i = 0; i < n; i++) s[i] = roln_normal(seed);
        for (i = friction_at; i < base_at; i++) th[i] = 3 * roln_normal(seed);
        for (i = 0; f.damping && i < friction_at - damper_at; i++) th[damper_at + i] = 0;
        friction(&f, th, s, d, tape, w);
        for (i = 0; i < n; i++) {
            const ld c = expl((ld)th[friction_at + i]), v = expl((ld)th[friction_at + n + i]), want = c * tanhl((ld)s[n + i] / v);
            CHECK(d[i] * s[n + i] >= 0);
            BOUND("friction (eps)", fabsl((ld)d[i] - want) / (EPS * fabsl(want)), 12);
            th[friction_at + i] = -200; /* e^-200: none */
        }
        friction(&f, th, s, smooth, tape, w);
        for (i = 0; i < n; i++) CHECK_NEAR(smooth[i], 0, 1e-30);
        fresh_done();
    }
}

/* Both laws of friction and drag take power at any velocity and with any weights: each coordinate of friction by itself, drag as
   sum |y_i|^3. At rest they are 0, without a potential the load is, and huge numbers stay numbers. */
static void test_drives(uint64_t *seed)
{
    int rep, i, j;
    for (rep = 0; rep < 1000; rep++) {
        const int n = 1 + rep % 5, size = ROLN_TRI(n) + n * n;
        const roln_lnn f = rep % 2 ? grinding(shape(n, 0, 2, 2, 0)) : dragged(shape(n, 0, 2, 2, 0));
        const roln_real speed = (roln_real)pow(10, rep % 9 - 4);
        roln_real *th = weights(&f, seed), *s = normal(2 * n, 1, seed), *d = fresh(n), *still = fresh(n);
        roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(TERMS_WORK);
        ld z[MAXN], zd[MAXN], u[ROLN_TRI(MAXN) + MAXN * MAXN], y, most, power = 0, want = 0, top = 0;
        for (i = damper_at; i < friction_at; i++) th[i] *= 2;
        for (i = friction_at; i < base_at; i++) th[i] = 3 * roln_normal(seed);
        for (i = friction_at - size; rep % 2 == 0 && i < friction_at - n * n; i++) th[i] = 0; /* drag alone: L is 0 */
        for (i = 0; rep % 2 == 0 && i < 2 * ROLN_TRI(n); i++) th[friction_at - size - 2 * size + i] = 0;
        for (i = 0; rep % 10 == 1 && i < roln_mlp_params(&f.potential_net); i++) th[roln_mlp_params(&f.mass_net) + i] = 0;
        for (i = 0; i < n; i++) s[n + i] *= rep % 11 == 0 && i == 0 ? 0 : speed;
        widen(roln_lnn_params(&f), th, m.th), widen(n, s, z), widen(n, s + n, zd);
        friction(&f, th, s, d, tape, w);
        t_terms(z, zd);
        for (i = 0; i < n && rep % 2; i++) { /* in units of the levels, of which 1 + a y and 1 - Y^2 may leave next to nothing */
            const ld *law = m.th + friction_at + i;
            const ld level = expl(law[0]) + expl(law[2 * n]) + expl(law[4 * n]) * (largest(n, tt.g) + 1);
            CHECK(d[i] * s[n + i] >= 0 && (s[n + i] != 0 || d[i] == 0));
            BOUND("drives: friction (eps of the levels)", fabsl((ld)d[i] - tt.d[i]) / (EPS * level), 12);
        }
        if (rep % 2 == 0) {
            t_mlp(&f.damper_net, m.th + damper_at, z, u);
            for (j = 0; j < n; j++) { /* y, and the size of its terms, in which W has its rounding */
                for (y = most = 0, i = 0; i < n; i++)
                    y += u[ROLN_TRI(n) + i * n + j] * zd[i], most += (1 + fabsl(u[ROLN_TRI(n) + i * n + j])) * fabsl(zd[i]);
                want += fabsl(y * y * y), top += most * most * most;
            }
            for (i = 0; i < n; i++) power += zd[i] * (ld)d[i];
            BOUND("drives: zd . d is sum |y|^3 (eps)", fabsl(power - want) / (EPS * top + 1e-300L), 12);
        }
        for (i = 0; i < n; i++) s[n + i] = 0;
        friction(&f, th, s, still, tape, w);
        for (i = 0; i < n; i++) CHECK(still[i] == 0), s[n + i] = i % 2 ? ROLN_C(-1e9) : ROLN_C(1e9);
        friction(&f, th, s, d, tape, w);
        CHECK(roln_all_finite(n, d));
        fresh_done();
    }
}

/* What both start from: little, the velocity w of Stribeck above v, no asymmetry; W near I / 4. */
static void test_drives_start(uint64_t *seed)
{
    static const double start[6] = {-2, -2, -4, -1, -4, 0};
    const roln_lnn f = grinding(dragged(shape(3, 0, 2, 4, 0)));
    roln_real *th = weights(&f, seed);
    int i;
    roln_lnn_init(&f, th, seed);
    for (i = friction_at; i < base_at; i++) CHECK_NEAR(th[i], start[(i - friction_at) / 3], 0);
    for (i = 0; i < 9; i++) CHECK(th[friction_at - 9 + i] == (roln_real)(i % 4 == 0) / 4);
    for (i = friction_at - 15; i < friction_at - 9; i++) CHECK(th[i] == 0);
    fresh_done();
}

/* Whole turns of an angle change nothing but by the rounding of the angle: terms, zdd, the start from two positions. An angle
   beyond 2^20 is none. */
static void check_turned(roln_lnn f, int turns, uint64_t *seed)
{
    const int n = f.n, nx = n * n + 3 * n + 2, steep = f.mass_net.degree > 0 ? f.mass_net.degree * f.mass_net.degree : 1;
    roln_real *th = weights(&f, seed), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    roln_real *X[2], *zdd[2], *s1[2], *s, *z0, *out = zeros(2 * n), *before = copy(2 * n, out);
    roln_system sys = {NULL, NULL};
    ld ref[MAXN * MAXN + 3 * MAXN + 2];
    inputs x = draw(&f, th, ZDD, 1, 0, seed);
    int k, i;
    sys.theta = th;
    for (k = 0; k < 2; k++) {
        X[k] = fresh(nx), zdd[k] = fresh(n), s1[k] = fresh(2 * n), s = copy(2 * n, x.s), z0 = copy(n, x.s);
        for (i = 0; i < n; i++) {
            const ld turn = k && (f.angles >> i & 1) ? 8 * atanl(1) * turns : 0;
            s[i] = (roln_real)((ld)s[i] + turn), z0[i] = (roln_real)((ld)z0[i] - (ld)ROLN_C(0.03125) * (ld)s[n + i] - turn);
        }
        CHECK(terms(th, s, -1, X[k], tape, w) == ROLN_OK);
        CHECK(roln_lnn_zdd(&f, 0, 1, th, s, x.a[0], zdd[k], tape, w) == ROLN_OK);
        CHECK(roln_lnn_start(&f, &sys, 0, 1, ROLN_C(0.03125), z0, s, s1[k], tape, w) == ROLN_OK);
        CHECK(same(n, s, s1[k]));
    }
    widen(nx, X[0], ref);
    BOUND("turns: terms (eps a turn)", distance(nx, X[1], ref) / EPS / (1 + fabsl((ld)turns)) / steep, 8);
    widen(n, zdd[0], ref);
    BOUND("turns: zdd (eps a turn)", distance(n, zdd[1], ref) / EPS / (1 + fabsl((ld)turns)) / steep, 40);
    BOUND("turns: start (eps a turn / h)", apart(n, s1[0] + n, s1[1] + n) / EPS / (1 + fabsl((ld)turns)) / 32, 16);
    for (i = 0; i < n; i++) {
        s = copy(2 * n, x.s);
        s[i] = 1048577;
        k = roln_lnn_zdd(&f, 0, 1, th, s, x.a[0], out, tape, w) == ROLN_E_NOT_FINITE;
        CHECK(!(f.angles >> i & 1) || (k && same(n, out, before)));
        memcpy(out, before, (size_t)n * sizeof *out);
    }
    fresh_done();
}

static void test_turns(uint64_t *seed)
{
    static const int turns[] = {1, -1, 3, -20, 100};
    int i, rep;
    for (rep = 0; rep < 20; rep++)
        for (i = VARIANTS; i <= TURNING; i++) check_turned(variant(i < TURNING ? i : GROWING + 2), turns[rep % 5], seed);
}

/* p [n] = M zd at s. Returns what rounding of M^-1 p and then of M zd may change, in eps: the sum of the magnitudes of the terms of
   a p_i, at most, times the condition of M. */
static ld momenta(const roln_lnn *f, const roln_real *th, const roln_real *s, ld *p, roln_real *tape, roln_real *w)
{
    const int n = f->n;
    roln_real M[MAXN * MAXN];
    roln_dynamics_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
    ld X[MAXN * MAXN], l[MAXN], top = 0, size, low, high;
    int i, j;
    out.M = M;
    CHECK(roln_lnn_dynamics(f, th, s, &out, tape, w) == ROLN_OK);
    for (i = 0; i < n; i++) {
        for (p[i] = size = 0, j = 0; j < n; j++) {
            const ld term = (ld)M[i * n + j] * (ld)s[n + j];
            p[i] += term, size += fabsl(term);
        }
        top = ROLN_MAX(top, size);
    }
    widen(n * n, M, X);
    t_spectral(LOG, n, X, X, l);
    for (low = high = l[0], i = 1; i < n; i++) low = ROLN_MIN(low, l[i]), high = ROLN_MAX(high, l[i]);
    return top * high / low;
}

/* Without friction the momentum of an ignorable coordinate changes by h tau_j in a step of the midpoint rule, and by 0 without
   force. That of another coordinate changes in another way. */
static void check_momenta(const roln_lnn *f, unsigned bits, const roln_real *th, const roln_real *s, roln_real *tau)
{
    enum { STEPS = 100 };
    const roln_real h = ROLN_C(0.015625);
    roln_real *x = copy(2 * f->n, s), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    ld before[MAXN], after[MAXN], size, now;
    roln_force force;
    const roln_system sys = {th, tau ? &force : NULL};
    int k, j;
    force.eval = const_eval, force.bwd = NULL, force.jac = NULL, force.ctx = tau, force.jac_zd = NULL;
    size = momenta(f, th, x, before, tape, w);
    for (k = 0; k < STEPS; k++) {
        CHECK(roln_lnn_step(f, &sys, ROLN_MIDPOINT, 0, 1, h, x, x, tape, w) == ROLN_OK);
        now = momenta(f, th, x, after, tape, w), size = ROLN_MAX(size, now);
    }
    for (j = 0; j < f->n; j++) {
        const ld off = fabsl(after[j] - before[j] - (tau ? STEPS * (ld)h * (ld)tau[j] : 0));
        if (bits >> j & 1) BOUND("momentum of an ignorable coordinate (eps a step)", off / (size * EPS * STEPS), 4);
        else CHECK(off > 5e-4L * (fabsl(before[j]) + fabsl(after[j])));
    }
}

/* Nothing depends on an ignorable coordinate, to the bit. */
static void check_cyclic(roln_lnn f, unsigned bits, uint64_t *seed)
{
    const int n = f.n, nx = n * n + 3 * n + 2;
    roln_real *th, *X[2], *s[2], *tau, *tape, *w, *zdd[2];
    int k, i;
    cyclic = bits, th = weights(&f, seed), cyclic = 0;
    s[0] = normal(2 * n, 0.5, seed), s[1] = copy(2 * n, s[0]), tau = normal(n, 0.3, seed);
    tape = fresh(TAPE(1, 0, 1)), w = fresh(any_work(1));
    for (i = 0; i < n; i++)
        if (bits >> i & 1) s[1][i] += f.angles >> i & 1 ? ROLN_C(2.7) : ROLN_C(1e6);
    for (k = 0; k < 2; k++) {
        X[k] = fresh(nx), zdd[k] = fresh(n);
        CHECK(terms(th, s[k], -1, X[k], tape, w) == ROLN_OK);
        CHECK(roln_lnn_zdd(&f, 0, 1, th, s[k], tau, zdd[k], tape, w) == ROLN_OK);
    }
    CHECK(same(nx, X[0], X[1]) && same(n, zdd[0], zdd[1]));
    for (i = 0; i < n; i++) CHECK((X[0][term_at(2) + i] == 0) == (int)(bits >> i & 1));
    if (!f.damping && !f.friction) check_momenta(&f, bits, th, s[0], NULL), check_momenta(&f, bits, th, s[0], tau);
    fresh_done();
}

/* Numbers and angles, none, some and all ignorable. All of them: M is constant, without Coriolis and gravity terms. */
static void test_cyclic(uint64_t *seed)
{
    roln_real *th, *s, *X, *tape, *w;
    roln_lnn f;
    int rep, i;
    for (rep = 0; rep < 8; rep++) {
        check_cyclic(shape(3, rep % 2, 2, 6, 0), (unsigned)rep, seed);
        check_cyclic(turning(shape(3, 0, 3, 5, 4), 5), (unsigned)rep, seed);
        check_cyclic(behind(shape(3, 0, 2, 5, 0), 1), (unsigned)rep, seed);
        check_cyclic(rubbing(damped(cholesky(shape(3, 0, 2, 5, 0)))), (unsigned)rep, seed);
    }
    f = turning(shape(3, 1, 2, 6, 0), 2);
    cyclic = 7, th = weights(&f, seed), cyclic = 0;
    s = normal(6, 1, seed), X = fresh(9 + 9 + 2), tape = fresh(TAPE(1, 0, 1)), w = fresh(any_work(1));
    CHECK(terms(th, s, -1, X, tape, w) == ROLN_OK);
    for (i = 0; i < 6; i++) CHECK(X[9 + i] == 0);
    fresh_done();
}

void TEST_NAME(lnn_motion)(void)
{
    uint64_t seed = 3;
    test_order(&seed);
    test_energy(&seed);
    test_power(&seed);
    test_damping(&seed);
    test_turns(&seed);
    test_rubbing(&seed);
    test_drives(&seed);
    test_drives_start(&seed);
    test_cyclic(&seed);
    print_bounds();
}
