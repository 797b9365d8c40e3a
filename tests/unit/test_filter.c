/* SPDX-License-Identifier: MIT */
/* The Kalman filter (NAME_filter_tick): one tick against the textbook in long double with dense covariances, the steady state
   against roln_dare, consistency on simulated noise, what is not measured, what is beyond the gate, new starts, angles on any
   turn, a load, a million ticks of everything, wrong settings. */
#define LOADED_CALLS(X) X(filter_tick) X(control) X(tick)
#define FILTER_CALLS(X) \
    X(encode) X(decode) X(push) X(slopes) X(reduce) X(lift) X(dynamics) X(inverse) X(control) X(filter_tick) X(in_range)
#include "filter.h"

void TEST_NAME(filter)(void);

/* ---- a tick against the textbook -------------------------------------------------------------- */

/* C [a][b] = A [a][p] B [p][b], or A B^T. */
static void times(int a, int p, int b, const ld *A, const ld *B, int turned, ld *C)
{
    int i, j, l;
    for (i = 0; i < a; i++)
        for (j = 0; j < b; j++)
            for (C[i * b + j] = 0, l = 0; l < p; l++)
                C[i * b + j] += A[i * p + l] * B[turned ? j * p + l : l * b + j];
}

/* X [n][n] = A^-1. */
static void invert(int n, const ld *A, ld *X)
{
    static ld B[SIDE * SIDE];
    int i;
    memcpy(B, A, (size_t)(n * n) * sizeof *B);
    for (i = 0; i < n * n; i++)
        X[i] = i % (n + 1) == 0;
    t_solve(n, n, B, X);
}

typedef struct {
    ld x[SIDE], P[SIDE * SIDE], nis;
    ld ahead[SIDE * SIDE]; /* P in front of the measurement */
    roln_real A[SIDE * SIDE], s[SIDE]; /* A [side][side] */
    ld J[MAXN * MAXN], q[MAXN], G[SIDE * MAXN];
    ld spread; /* how far P moves where entries of J are rounded, in eps of `ahead` */
} twin;

/* x and P of an estimate. */
static void widen_estimate(int n, const estimate *e, twin *t)
{
    const int side = side_of(n);
    int i, j, l;
    for (i = 0; i < n; i++) {
        t->x[i] = (ld)e->z[i], t->x[n + i] = (ld)e->zd[i];
        if (loaded) t->x[2 * n + i] = (ld)e->load[i];
    }
    for (i = 0; i < side; i++)
        for (j = 0; j < side; j++)
            for (t->P[i * side + j] = 0, l = 0; l < side; l++)
                t->P[i * side + j] += (ld)e->F[l * side + i] * (ld)e->F[l * side + j];
}

/* q and J at z. */
static void look(int k, const roln_real *z, twin *t)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real e[MAXN], q[MAXN], qd[MAXN];
    int i, j;
    for (j = 0; j < n; j++) {
        fill(n, 0, e), e[j] = 1;
        CHECK_OK(m.of->decode(&m, z, e, q, qd, spare));
        for (i = 0; i < N; i++)
            t->q[i] = (ld)q[i], t->J[i * n + j] = (ld)qd[i];
    }
}

/* x, P a tick on: NAME_linear, and P = A P A^T + G diag(tau^2) G^T with G = [dt^2 / 2 M^-1 J^T; dt M^-1 J^T],
   and what the load wanders, dt load^2 J^T J. Leapfrog has M half a step back, and forces half a step ahead. */
static void wander(int k, const rig *r, ld seconds, twin *t)
{
    const int N = N_OF(k), n = n_OF(k), side = side_of(n);
    int i, j, l;
    for (i = 0; i < n && loaded; i++)
        for (j = 0; j < n; j++)
            for (l = 0; l < N; l++)
                t->P[(2 * n + i) * side + 2 * n + j] +=
                    seconds * (ld)r->noise.load * (ld)r->noise.load * t->J[l * n + i] * t->J[l * n + j];
}

static int ahead(int k, const rig *r, twin *t)
{
    static roln_real A2[SIDE * SIDE], L[SIDE * MAXN];
    static ld A[SIDE * SIDE], AP[SIDE * SIDE], M[MAXN * MAXN], W[MAXN * MAXN], Q[SIDE * SIDE];
    roln_real mass[MAXN * MAXN];
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), n2 = 2 * n, side = side_of(n);
    const slopes_at to = {A2, NULL, loaded ? L : NULL};
    const terms_at out = {mass, NULL, NULL, NULL, NULL, NULL};
    const ld h = (ld)r->noise.dt;
    roln_real middle[MAXN];
    int i, j;
    for (i = 0; i < side; i++)
        t->s[i] = (roln_real)t->x[i];
    for (i = 0; i < n; i++)
        middle[i] = t->s[i] + r->noise.dt / 2 * t->s[n + i];
    half_ahead(n, r->noise.dt, r->e.zdd, t->s, t->s + n);
    if (m.of->slopes(&m, t->s, t->s + n, r->tau, loaded ? t->s + n2 : NULL, r->noise.dt, &to, spare) != ROLN_OK) return 0;
    half_ahead(n, -r->noise.dt, r->e.zdd, t->s, t->s + n);
    for (i = 0; i < side; i++)
        for (j = 0; j < side; j++)
            t->A[i * side + j] = i >= n2 ? (roln_real)(i == j) : j < n2 ? A2[i * n2 + j] : L[i * n + j - n2];
    look(k, t->s, t);
    CHECK_OK(m.of->dynamics(&m, leaps ? middle : t->s, t->s + n, &out, spare));
    widen(n * n, mass, M), widen(side * side, t->A, A);
    invert(n, M, W);
    for (i = 0; i < n; i++)
        for (j = 0; j < N; j++) {
            ld sum = 0;
            int l;
            for (l = 0; l < n; l++)
                sum += W[i * n + l] * t->J[j * n + l];
            sum *= (ld)(r->noise.tau_each ? r->noise.tau_each[j] : r->noise.tau) * (m.of->in_range(&m, t->s, t->s + n) ? 1 : 10);
            t->G[i * N + j] = h * h / 2 * sum, t->G[(n + i) * N + j] = h * sum;
        }
    times(side, side, side, A, t->P, 0, AP);
    times(side, side, side, AP, A, 1, t->P);
    times(n2, N, n2, t->G, t->G, 1, Q);
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            t->P[i * side + j] += Q[i * n2 + j];
    wander(k, r, h, t);
    memcpy(t->ahead, t->P, sizeof t->P);
    widen(side, t->s, t->x);
    return 1;
}

/* The joints that are measured add their information, P^-1 += J^T R^-1 J, x += P J^T R^-1 e, nis = dx^T P^-1 dx + |e - J dx|^2
   / R: the same as by a gain, of which long double rounds too much away. */
static void correct(int k, const rig *r, twin *t)
{
    static ld I[SIDE * SIDE], I0[SIDE * SIDE];
    const int N = N_OF(k), n = n_OF(k), n2 = side_of(n);
    ld e[MAXN], weight[MAXN], b[SIDE] = {0}, d[SIDE];
    int i, j, l;
    invert(n2, t->P, I0), memcpy(I, I0, sizeof I);
    for (i = 0; i < N; i++) {
        const ld deviation = (ld)(r->noise.q_each ? r->noise.q_each[i] : r->noise.q);
        weight[i] = roln_finite(r->y[i]) ? 1 / (deviation * deviation) : 0;
        e[i] = roln_finite(r->y[i]) ? (ld)(r->y[i] - roln_lnn_near(&models[k]->md->lnn, i, r->y[i], (roln_real)t->q[i])) : 0;
        for (j = 0; j < n; j++) {
            b[j] += t->J[i * n + j] * weight[i] * e[i];
            for (l = 0; l < n; l++)
                I[j * n2 + l] += t->J[i * n + j] * weight[i] * t->J[i * n + l];
        }
    }
    invert(n2, I, t->P);
    times(n2, n2, 1, t->P, b, 0, d);
    for (t->nis = 0, i = 0; i < N; i++) {
        ld rest = e[i];
        for (j = 0; j < n; j++)
            rest -= t->J[i * n + j] * d[j];
        t->nis += rest * weight[i] * rest;
    }
    for (i = 0; i < n2; i++) {
        for (j = 0; j < n2; j++)
            t->nis += d[i] * I0[i * n2 + j] * d[j];
        t->x[i] += d[i];
    }
}

/* The largest difference of P from P0, in deviations in front of the measurement. */
static ld off(int n2, const twin *t, const ld *P, const ld *P0)
{
    ld worst = 0;
    int i, j;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) {
            const ld wide = sqrtl(t->ahead[i * (n2 + 1)] * t->ahead[j * (n2 + 1)]);
            worst = fmaxl(worst, fabsl(P[i * n2 + j] - P0[i * n2 + j]) / wide);
        }
    return worst;
}

/* A measurement, and what it makes of one eps in each entry of J: a joint that is measured sharply may narrow P by its own
   column of J alone. */
static void textbook(int k, const rig *r, twin *t)
{
    static twin moved;
    const twin before = *t;
    int i;
    correct(k, r, t);
    for (t->spread = 0, i = 0; i < N_OF(k) * n_OF(k); i++) {
        moved = before;
        moved.J[i] *= 1 + (ld)EPS;
        correct(k, r, &moved);
        t->spread += off(side_of(n_OF(k)), t, moved.P, t->P) / EPS;
    }
}

/* The estimate is the twin's: errors in eps of the deviations in front of the measurement and in what rounding of J makes of them;
   a part of eps of the numbers themselves. */
static void check_tick(int k, const estimate *e, const twin *t)
{
    static twin mine;
    const int n = n_OF(k), n2 = side_of(n);
    ld worst;
    int i;
    widen_estimate(n, e, &mine);
    worst = off(n2, t, mine.P, t->P);
    for (i = 0; i < n2; i++)
        worst = fmaxl(worst, fabsl(mine.x[i] - t->x[i]) / (sqrtl(t->ahead[i * (n2 + 1)]) + fabsl(t->x[i])));
    BOUND("filter: a tick, deviations, eps of J and of P", worst / EPS / (1 + t->spread), 200);
    BOUND("filter: nis", fabsl((ld)e->f.nis - t->nis) / (1 + t->nis) / EPS, 500);
}

static void test_tick(int k)
{
    static rig x;
    static twin t;
    uint64_t s = 900 + (uint64_t)k, seed = s;
    int round, i, missing;
    if (k == DEEP) return; /* J of size 1e3, beyond the digits of float */
    for (round = 0; round < 40; round++) {
        const int N = N_OF(k);
        place(k, &s, round % 2 ? 1 : ROLN_C(0.015625), &x);
        if (leaps && round > 1) dyadic(n_OF(k), 2, &seed, x.e.zdd);
        if (round % 4 == 3) x.noise.q_each = x.noise.tau_each = NULL;
        if (round % 5 == 4) zd_max[0] = ROLN_C(0.125); /* out of range */
        widen_estimate(n_OF(k), &x.e, &t);
        if (!ahead(k, &x, &t)) continue;
        for (missing = 0, i = 0; i < N && round > 1; i++)
            if (roln_randint(3, &s) == 0) x.y[i] = i % 2 ? (roln_real)NAN : (roln_real)-INFINITY, missing++;
        if (missing < N) textbook(k, &x, &t);
        else t.nis = t.spread = 0;
        {
            const uint32_t faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
            const instance m = of_model(k);
            CHECK((faults & ~(uint32_t)ROLN_FAULT_RANGE) == (missing > 0 ? ROLN_FILTER_MISSING : 0));
            CHECK(((faults & ROLN_FAULT_RANGE) == 0) == (m.of->in_range(&m, x.e.z, x.e.zd) != 0));
            CHECK(x.e.f.used == N - missing && x.e.f.outliers == 0 && x.e.f.starts == 1 && x.e.f.valid == 1);
        }
        check_tick(k, &x.e, &t);
    }
}

/* ---- the steady state ------------------------------------------------------------------------- */

/* At a pose that tau holds, measured without error, P in front of a measurement becomes that of the Riccati equation of the filter:
   that of feedback (roln_dare) for A^T, B = H^T, with D the factor of Q. */
static void test_steady(int k)
{
    enum { TICKS = 2000 };
    static rig x;
    static twin t;
    static roln_real A[SIDE * SIDE], B[SIDE * MAXN], D[SIDE * SIDE], C[SIDE * SIDE], K[SIDE * MAXN];
    static ld P[SIDE * SIDE];
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), n2 = 2 * n;
    roln_real still[MAXN] = {0}, tau_z[MAXN], r[MAXN], qd[MAXN], pose[MAXN];
    uint64_t s = 950 + (uint64_t)k;
    ld worst = 0;
    int i, j;
    if (loaded || models[k]->md->inputs > 0 || k == DEEP) return; /* nothing holds it; J of size 1e3 */
    place(k, &s, 1, &x);
    fill(n, 0, x.e.zd), memcpy(pose, x.e.z, sizeof pose);
    CHECK_OK(m.of->inverse(&m, pose, still, NULL, still, tau_z, spare));
    CHECK_OK(m.of->lift(&m, pose, tau_z, x.tau, spare));
    CHECK_OK(m.of->decode(&m, pose, still, x.y, qd, spare));
    for (i = 0; i < TICKS; i++)
        CHECK((tick_of(k, &x.noise, x.y, x.tau, &x.e) & ~(uint32_t)ROLN_FAULT_RANGE) == 0);
    BOUND("filter: held pose, eps", furthest(n, x.e.z, pose) / EPS, 4);
    BOUND("filter: velocity of it, eps", largest(n, x.e.zd) / EPS, 400);
    memcpy(x.e.z, pose, sizeof pose), fill(n, 0, x.e.zd);
    widen_estimate(n, &x.e, &t);
    if (!CHECK(ahead(k, &x, &t))) return;
    fill(SIDE * SIDE, 0, D); /* a factor of Q: D^T D = G G^T */
    for (i = 0; i < N; i++)
        for (j = 0; j < n2; j++)
            D[i * n2 + j] = (roln_real)t.G[j * N + i];
    roln_qr_r(N, n2, D, spare);
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            A[i * n2 + j] = t.A[j * n2 + i];
    for (i = 0; i < N; i++)
        for (r[i] = x.q_each[i] * x.q_each[i], j = 0; j < n2; j++)
            B[j * N + i] = j < n ? (roln_real)t.J[i * n + j] : 0;
    if (!CHECK_OK(roln_dare(n2, N, A, B, D, r, C, K, spare))) return;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) {
            int l;
            for (P[i * n2 + j] = 0, l = 0; l < n2; l++)
                P[i * n2 + j] += (ld)C[l * n2 + i] * (ld)C[l * n2 + j];
        }
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            worst = fmaxl(worst, fabsl(P[i * n2 + j] - t.ahead[i * n2 + j]) / sqrtl(P[i * (n2 + 1)] * P[j * (n2 + 1)]));
    BOUND("filter: steady state and roln_dare, eps", worst / EPS, 20);
}

/* ---- consistency ------------------------------------------------------------------------------ */

/* d^T (F^T F)^-1 d */
static ld squared_error(int k, const estimate *e, const roln_real *z, const roln_real *zd)
{
    static ld P[SIDE * SIDE];
    static twin t;
    const int n = n_OF(k), side = side_of(n);
    ld d[SIDE], x[SIDE], sum = 0;
    int i;
    widen_estimate(n, e, &t);
    memcpy(P, t.P, sizeof P);
    for (i = 0; i < n; i++) {
        d[i] = (ld)(z[i] - roln_lnn_near(&models[k]->md->lnn, i, z[i], e->z[i]));
        d[n + i] = (ld)(zd[i] - e->zd[i]);
        if (loaded) d[2 * n + i] = (ld)(burden[i] - e->load[i]);
    }
    memcpy(x, d, sizeof x);
    t_solve(side, 1, P, x);
    for (i = 0; i < side; i++)
        sum += x[i] * d[i];
    return sum;
}

/* The error that the filter makes is the one that it expects: NEES 2 n, with a load 3 n, NIS N, a tick. */
static void test_consistent(int k)
{
    enum { RUNS = 40, TICKS = 60, SETTLED = 30 };
    static rig x;
    const int N = N_OF(k), side = side_of(n_OF(k));
    uint64_t s = 1000 + (uint64_t)k;
    double nees = 0, nis = 0;
    int run, i, count = 0;
    if (k == DEEP || k == PUSHED) return; /* J of size 1e3; midpoint does not always converge */
    for (run = 0; run < RUNS; run++) {
        roln_real z[MAXN], zd[MAXN];
        place(k, &s, 1, &x);
        for (i = 0; i < N; i++)
            x.tau_each[i] *= ROLN_C(0.25), x.tau[i] *= ROLN_C(0.5);
        x.noise.load *= ROLN_C(0.25);
        memcpy(z, x.e.z, sizeof z), memcpy(zd, x.e.zd, sizeof zd);
        memset(&x.e, 0, sizeof x.e), memset(burden, 0, sizeof burden), memset(last, 0, sizeof last), restless = 1;
        for (i = 0; i < TICKS; i++) {
            const uint32_t faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
            CHECK(faults == (i == 0 ? ROLN_FILTER_START : 0) || faults & ROLN_FAULT_RANGE);
            if (i >= SETTLED) nees += (double)squared_error(k, &x.e, z, zd) / side, nis += (double)x.e.f.nis / N, count++;
            simulate(k, &x, &s, z, zd, x.y);
        }
    }
    BOUND(loaded ? "filter: NEES / 3n - 1" : "filter: NEES / 2n - 1", fabs(nees / count - 1), 0.2);
    BOUND("filter: NIS / N - 1", fabs(nis / count - 1), 0.06);
}

/* ---- a load ----------------------------------------------------------------------------------- */

/* s [2n] after a step of model k under tau and a load. */
static void pushed_to(int k, const rig *x, const roln_real *load, roln_real *s)
{
    const instance m = of_model(k);
    const int n = n_OF(k);
    memcpy(s, x->e.z, (size_t)n * sizeof *s), memcpy(s + n, x->e.zd, (size_t)n * sizeof *s);
    CHECK_OK(m.of->push(&m, s, s + n, x->tau, load, 4 * x->noise.dt, spare));
}

/* The worst of d s+ / d x - what column j of it is said to be, by central differences, a step h each way; x is a number of *at. */
static ld slope_error(int k, const rig *at, roln_real *x, roln_real h, const roln_real *column, int stride)
{
    const int n = n_OF(k);
    const roln_real was = *x;
    roln_real up[SIDE], down[SIDE];
    ld worst = 0;
    int i;
    *x = was + h, pushed_to(k, at, at->e.load, up);
    *x = was - h, pushed_to(k, at, at->e.load, down);
    *x = was;
    for (i = 0; i < 2 * n; i++)
        worst = fmaxl(worst, fabsl(((ld)up[i] - (ld)down[i]) / (2 * (ld)h) - (ld)column[i * stride]));
    return worst;
}

/* A, B, L of a step under a load against central differences, whose error falls to a quarter with half the step; where z is q, a
   load is a torque. */
static void test_push(int k)
{
    static rig x;
    static roln_real A[SIDE * SIDE], B[SIDE * MAXN], L[SIDE * MAXN], A2[SIDE * SIDE];
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), n2 = 2 * n, F = F_OF(k), columns[3] = {n2, F, n};
    const slopes_at to_B = {A2, B, NULL}, to_L = {A, NULL, L};
    const roln_real *const of[3] = {A, B, L};
    roln_real s[SIDE], s2[SIDE];
    uint64_t seed = 880 + (uint64_t)k;
    int i, l, j;
    if (k == DEEP || k == PUSHED) return; /* J of size 1e3; midpoint does not always converge */
    place(k, &seed, 1, &x);
    memcpy(s, x.e.z, sizeof x.e.z), memcpy(s + n, x.e.zd, (size_t)n * sizeof *s), memcpy(s2, s, sizeof s);
    CHECK_OK(m.of->slopes(&m, s, s + n, x.tau, x.e.load, 4 * x.noise.dt, &to_L, spare));
    CHECK_OK(m.of->slopes(&m, s2, s2 + n, x.tau, x.e.load, 4 * x.noise.dt, &to_B, spare));
    CHECK(same(n2, s, s2) && same(n2 * n2, A, A2));
    pushed_to(k, &x, x.e.load, s2);
    BOUND("load: a linearised step is a step, eps", furthest(n2, s, s2) / EPS, 16);
    for (l = 0; l < 3; l++)
        for (j = 0; j < columns[l]; j++) {
            roln_real *const of_j = l == 1 ? x.tau + j : l == 2 ? x.e.load + j : j < n ? x.e.z + j : x.e.zd + j - n;
            const ld noise = 200 * EPS, e1 = slope_error(k, &x, of_j, ROLN_C(0.0625), of[l] + j, columns[l]);
            const ld e2 = slope_error(k, &x, of_j, ROLN_C(0.03125), of[l] + j, columns[l]);
            BOUND("load: slopes, a quarter", (e2 - noise) / (e1 + noise), 0.3);
        }
    if (models[k]->md->ae.layers > 0) return;
    pushed_to(k, &x, x.e.load, s);
    for (i = 0; i < N; i++)
        x.tau[i] += x.e.load[i] / scale_of(k)->q;
    pushed_to(k, &x, NULL, s2);
    BOUND("load: is a torque, eps", furthest(n2, s, s2) / EPS, 16);
}

/* Model k under a constant load that nobody knows, held at a pose by PD+ on what the filter says of its positions: the mean of z -
   ref of the last ticks, `compensated` by the estimated load or not; *of: what that misses of the load, as a part of it. */
static ld held(int k, int compensated, ld *of)
{
    enum { TICKS = 1200, LAST = 200 };
    static rig x;
    const instance m = of_model(k), with = filled(with_load[k], k);
    const int n = n_OF(k);
    roln_real z[MAXN], zd[MAXN] = {0}, ref[MAXN], still[MAXN] = {0}, gain[MAXN], tau_z[MAXN], mean[2][MAXN] = {{0}};
    const target_at target = {ref, still, still, gain, gain, compensated ? x.e.load : NULL};
    uint64_t s = 890 + (uint64_t)k;
    int i, t;
    place(k, &s, 1, &x);
    memcpy(z, x.e.z, sizeof z), memcpy(ref, z, sizeof z), fill(MAXN, 4, gain);
    for (i = 0; i < n; i++)
        burden[i] = i % 2 ? ROLN_C(-0.25) : ROLN_C(0.375);
    fill(MAXN, ROLN_C(0.000244140625), x.q_each), fill(MAXN, 0, x.tau_each), fill(MAXN, 0, x.tau);
    x.noise.tau_each = NULL, x.noise.tau = ROLN_C(0.015625), x.noise.load = ROLN_C(0.25), restless = 0;
    memset(&x.e, 0, sizeof x.e);
    for (t = 0; t < TICKS; t++) {
        simulate(k, &x, &s, z, zd, x.y);
        CHECK((tick_of(k, &x.noise, x.y, x.tau, &x.e) & (ROLN_FAULT_STATUS | ROLN_FILTER_NONE)) == 0);
        CHECK_OK(with.of->control(&with, x.e.z, x.e.zd, &target, tau_z, spare));
        CHECK_OK(m.of->lift(&m, x.e.z, tau_z, x.tau, spare));
        for (i = 0; i < n && t >= TICKS - LAST; i++) {
            mean[0][i] += (z[i] - roln_lnn_near(&m.of->md->lnn, i, z[i], ref[i])) / LAST;
            mean[1][i] += (x.e.load[i] - burden[i]) / LAST;
        }
    }
    *of = largest(n, mean[1]) / largest(n, burden);
    return largest(n, mean[0]);
}

/* The load is found, and with it PD+ ends where it is to: the offset is a small part of the one without. No load, no offset. */
static void test_held(int k)
{
    const instance m = filled(with_load[k], k);
    roln_real x[6 * MAXN], tau_z[MAXN];
    const int n = n_OF(k);
    const target_at target = {x, x + n, x, x, x, x + 2 * n};
    ld off, with, without;
    if (k == DEEP || models[k]->md->inputs > 0) return; /* J of size 1e3; nothing holds it */
    without = held(k, 0, &off);
    BOUND("load: found, without it in the loop, a part", off, 0.03);
    with = held(k, 1, &off);
    BOUND("load: found, a part", off, 0.03);
    BOUND("load: offset, a part of that without", with / without, 0.03);
    CHECK(without > 0.01L);
    fill(6 * MAXN, ROLN_C(0.125), x), fill(MAXN, 7, tau_z);
    x[2 * n] = (roln_real)NAN;
    CHECK(m.of->control(&m, x, x, &target, tau_z, spare) == ROLN_E_NOT_FINITE && all(MAXN, tau_z, 7));
}

/* The energy residual of two ticks of model k that moves under a load, with its power or without. */
static ld residual_of(int k, int counted)
{
    static rig x;
    const instance m = of_model(k), with = filled(with_load[k], k);
    const int N = N_OF(k), n = n_OF(k);
    const roln_limits limits = {.dt = ROLN_C(0.0009765625), .margin = 10, .residual = 1000, .tau = 1000};
    roln_real q[MAXN], qd[MAXN], z[MAXN], zd[MAXN], still[MAXN] = {0}, tau[MAXN];
    const target_at target = {still, still, still, still, still, counted ? x.e.load : NULL};
    roln_guard guard = {.valid = 0};
    const guard_at to = {&guard, tau};
    uint64_t s = 893 + (uint64_t)k;
    int t;
    place(k, &s, 1, &x);
    fill(n, 2, x.e.load), fill(n, 1, x.e.zd), fill(N, 0, tau);
    for (t = 0; t < 2; t++) {
        CHECK_OK(m.of->decode(&m, x.e.z, x.e.zd, q, qd, spare));
        CHECK((with.of->tick(&with, &limits, q, qd, &target, z, zd, &to, spare) & ~(uint32_t)ROLN_FAULT_RANGE) == 0);
        if (t == 0) CHECK_OK(m.of->push(&m, x.e.z, x.e.zd, tau, x.e.load, limits.dt, spare));
    }
    return fabsl((ld)guard.residual);
}

/* What the load does is no fault: without it 2 n W and more or less, for zd = 1. */
static void test_guarded(int k)
{
    if (k == DEEP || models[k]->md->inputs > 0) return; /* J of size 1e3; lifted to motors */
    BOUND("load: residual, W", residual_of(k, 1), PICK(0.1, 0.02));
    BOUND("load: residual without its power, of 2 n W", fabsl(residual_of(k, 0) / (2 * n_OF(k)) - 1), 0.1);
}

/* A load that is none and does not wander: the filter without one. One that is not finite: it starts again. */
static void test_unladen(int k)
{
    static rig x, y;
    const int n = n_OF(k), side = 3 * n;
    uint64_t s = 895 + (uint64_t)k;
    uint32_t faults;
    int t, i, j;
    if (k == DEEP || k == PUSHED) return;
    loaded = 0, place(k, &s, ROLN_C(0.03125), &x), loaded = 1;
    y = x;
    fill(SIDE * SIDE, 0, y.e.F);
    for (i = 0; i < 2 * n; i++)
        for (j = 0; j < 2 * n; j++)
            y.e.F[i * side + j] = x.e.F[i * 2 * n + j];
    for (t = 0; t < 4; t++) {
        ld worst = 0, wide = 0;
        loaded = 0, faults = tick_of(k, &x.noise, x.y, x.tau, &x.e), loaded = 1;
        CHECK(tick_of(k, &x.noise, x.y, x.tau, &y.e) == faults && all(n, y.e.load, 0));
        for (i = 0; i < 2 * n; i++)
            for (j = 0; j < 2 * n; j++) {
                worst = fmaxl(worst, fabsl((ld)ROLN_ABS(y.e.F[i * side + j]) - (ld)ROLN_ABS(x.e.F[i * 2 * n + j])));
                wide = fmaxl(wide, fabsl((ld)x.e.F[i * 2 * n + j]));
            }
        BOUND("load: none, z", furthest(n, x.e.z, y.e.z), 400 * EPS);
        BOUND("load: none, F", worst / wide, 4000 * EPS);
    }
    y.e.load[n - 1] = (roln_real)NAN, y.e.f.faults = 0;
    faults = tick_of(k, &x.noise, x.y, x.tau, &y.e);
    CHECK((faults & (ROLN_FAULT_STATUS | ROLN_FILTER_START)) == (ROLN_FAULT_STATUS | ROLN_FILTER_START) && all(n, y.e.load, 0));
}

/* ---- measurements that are missing, or wrong -------------------------------------------------- */

static int equal(int k, const estimate *a, const estimate *b)
{
    const int n = n_OF(k), side = side_of(n);
    return same(n, a->z, b->z) && same(n, a->zd, b->zd) && same(side * side, a->F, b->F) && same(n, a->load, b->load);
}

/* No measurement is the step of the model; a joint beyond the gate is one that was not measured. */
static void test_gate(int k)
{
    static rig x, y;
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real none[MAXN];
    uint64_t s = 1050 + (uint64_t)k;
    uint32_t faults;
    int i, most;
    if (k == DEEP || k == PUSHED) return; /* J of size 1e3; midpoint does not always converge */
    place(k, &s, ROLN_C(0.0009765625), &x);
    fill(MAXN, (roln_real)NAN, none);
    y = x;
    CHECK((tick_of(k, &x.noise, NULL, x.tau, &x.e) & ~(uint32_t)ROLN_FAULT_RANGE) == ROLN_FILTER_MISSING);
    CHECK(x.e.f.used == 0 && x.e.f.lost == 0 && all(1, &x.e.f.nis, 0));
    tick_of(k, &x.noise, none, x.tau, &y.e);
    CHECK(equal(k, &x.e, &y.e));
    place(k, &s, ROLN_C(0.0009765625), &y);
    x = y;
    CHECK_OK(m.of->push(&m, x.e.z, x.e.zd, x.tau, loaded ? x.e.load : NULL, x.noise.dt, spare));
    tick_of(k, &y.noise, NULL, y.tau, &y.e);
    BOUND("filter: no measurement is a step", furthest(n, x.e.z, y.e.z) + furthest(n, x.e.zd, y.e.zd), EPS);

    for (most = 1; most <= N; most++) { /* joints that jump */
        rig z;
        uint64_t again = 77;
        place(k, &again, ROLN_C(0.0009765625), &x);
        y = z = x;
        x.noise.gate = 12; /* the noise passes */
        for (i = 0; i < most; i++)
            x.y[i] += i % 2 ? 1000 : -1000, z.y[i] = (roln_real)NAN;
        if (models[k]->md->lnn.angles) continue;
        faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
        CHECK(faults & ROLN_FILTER_OUTLIER && !(faults & (ROLN_FILTER_START | ROLN_FILTER_MISSING)));
        if (2 * most <= N) {
            tick_of(k, &z.noise, z.y, z.tau, &z.e);
            CHECK(equal(k, &x.e, &z.e) && x.e.f.used == N - most && x.e.f.outliers == (uint32_t)most);
        } else {
            tick_of(k, &y.noise, NULL, y.tau, &y.e);
            CHECK(equal(k, &x.e, &y.e) && x.e.f.used == 0 && x.e.f.outliers == (uint32_t)N);
        }
        CHECK(x.e.f.lost == (2 * most > N || N - most < n));
    }
    place(k, &s, ROLN_C(0.0009765625), &x);
    y = x;
    y.noise.gate = 12;
    tick_of(k, &x.noise, x.y, x.tau, &x.e), tick_of(k, &y.noise, y.y, y.tau, &y.e);
    CHECK(equal(k, &x.e, &y.e)); /* nothing is beyond it */
}

/* Where it starts: at the pose, at rest, as wide as the range, corrected by the same measurement. */
static void check_started(int k, const rig *x, const roln_real *pose, const estimate *e)
{
    static twin t;
    static rig at;
    const instance m = of_model(k);
    const int n = n_OF(k), side = side_of(n);
    roln_real still[MAXN] = {0};
    int i;
    at = *x;
    CHECK_OK(m.of->encode(&m, pose, still, at.e.z, at.e.zd, spare));
    fill(side * side, 0, at.e.F), fill(n, 0, at.e.load);
    for (i = 0; i < n; i++)
        at.e.F[i * (side + 1)] = z_max[i] - z_min[i], at.e.F[(n + i) * (side + 1)] = zd_max[i];
    widen_estimate(n, &at.e, &t);
    look(k, at.e.z, &t);
    wander(k, x, 1, &t); /* a second of it */
    memcpy(t.ahead, t.P, sizeof t.P);
    textbook(k, &at, &t);
    check_tick(k, e, &t);
    CHECK(all(n, e->zd, 0) && all(n, e->load, 0) && e->f.valid == 1 && e->f.lost == 0);
}

/* zd is what the model cannot go on from, or further out than ten widths of the range: the next measurement starts the filter, and
   a joint that is missing then is where it was last. */
static void check_failed_model(int k, rig x, roln_real zd)
{
    const instance m = of_model(k);
    const int N = N_OF(k);
    roln_real pose[MAXN], still[MAXN] = {0}, qd[MAXN];
    rig was;
    uint32_t faults;
    int i;
    x.e.zd[0] = zd;
    was = x;
    faults = tick_of(k, &x.noise, NULL, NULL, &x.e);
    CHECK(faults == (ROLN_FAULT_STATUS | ROLN_FILTER_MISSING | ROLN_FILTER_NONE) && equal(k, &x.e, &was.e) && x.e.f.valid == 0);
    if (N == n_OF(k)) return;
    CHECK_OK(m.of->decode(&m, x.e.z, still, pose, qd, spare));
    for (i = 1; i < N; i++)
        pose[i] = x.y[i];
    x.y[0] = (roln_real)NAN;
    faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
    CHECK((faults & ~(uint32_t)ROLN_FAULT_RANGE) == (ROLN_FILTER_MISSING | ROLN_FILTER_START) && x.e.f.starts == 3);
    check_started(k, &x, pose, &x.e);
}

/* It starts with the first measurement of every joint, again once it is lost, or where the model fails. */
static void test_starts(int k)
{
    static rig x, good, was;
    const int N = N_OF(k);
    uint64_t s = 1100 + (uint64_t)k;
    uint32_t faults;
    int i;
    if (k == DEEP || k == PUSHED || models[k]->md->lnn.angles) return; /* J of size 1e3; midpoint; a jump is a turn */
    place(k, &s, 1, &x);
    x.noise.gate = 12;
    memset(&x.e, 0, sizeof x.e);
    good = x;
    CHECK(tick_of(k, &x.noise, NULL, x.tau, &x.e) == (ROLN_FILTER_MISSING | ROLN_FILTER_NONE));
    x.y[N - 1] = (roln_real)NAN;
    CHECK(tick_of(k, &x.noise, x.y, x.tau, &x.e) == (ROLN_FILTER_MISSING | ROLN_FILTER_NONE));
    CHECK(equal(k, &x.e, &good.e) && x.e.f.valid == 0 && x.e.f.starts == 0);
    x = good, x.noise.q_each = NULL, x.noise.q = PICK(1e-39f, 1e-310); /* so little that the start overflows */
    CHECK((tick_of(k, &x.noise, x.y, x.tau, &x.e) & ~(uint32_t)ROLN_FAULT_RANGE) == (ROLN_FAULT_STATUS | ROLN_FILTER_NONE));
    CHECK(equal(k, &x.e, &good.e) && x.e.f.valid == 0 && x.e.f.used == 0 && all(1, &x.e.f.nis, 0));
    x = good;
    faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
    CHECK((faults & ~(uint32_t)ROLN_FAULT_RANGE) == ROLN_FILTER_START && x.e.f.starts == 1);
    check_started(k, &x, x.y, &x.e);
    for (i = 0; i < N; i++)
        x.y[i] += i % 2 ? ROLN_C(0.25) : ROLN_C(-0.25); /* somebody moved it */
    fill(SIDE * SIDE, 0, x.e.F), x.noise.tau = 0, x.noise.load /= 64, x.noise.tau_each = NULL; /* as sure as can be */
    for (i = 0; i < x.noise.lost; i++) {
        faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
        CHECK((faults & (ROLN_FILTER_OUTLIER | ROLN_FILTER_START)) == ROLN_FILTER_OUTLIER && x.e.f.lost == i + 1);
        if (i == 1) CHECK(tick_of(k, &x.noise, NULL, x.tau, &x.e) & ROLN_FILTER_MISSING && x.e.f.lost == 2); /* says nothing */
    }
    faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
    CHECK((faults & (ROLN_FILTER_OUTLIER | ROLN_FILTER_START)) == (ROLN_FILTER_OUTLIER | ROLN_FILTER_START) && x.e.f.starts == 2);
    check_started(k, &x, x.y, &x.e);

    good = x, x.e.z[0] = (roln_real)NAN, was = x; /* what is kept was damaged: only a measurement of all joints ends that */
    x.y[0] = (roln_real)NAN;
    faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
    CHECK(faults == (ROLN_FAULT_STATUS | ROLN_FILTER_MISSING | ROLN_FILTER_NONE) && equal(k, &x.e, &was.e) && x.e.f.valid == 0);
    x.y[0] = good.y[0];
    faults = tick_of(k, &x.noise, x.y, x.tau, &x.e);
    CHECK((faults & ~(uint32_t)ROLN_FAULT_RANGE) == ROLN_FILTER_START && x.e.f.starts == 3);
    check_started(k, &x, x.y, &x.e);
    x = good;

    check_failed_model(k, x, PICK(1e30f, 1e300));
    check_failed_model(k, x, 24 * zd_max[0]);
}

static ld apart(int i, roln_real a, roln_real b)
{
    return fabsl((ld)(a - roln_lnn_near(&wheel_model.lnn, i, a, b)));
}

/* An angle may be on any turn; the estimate is within (-pi, pi]. */
static void test_turns(void)
{
    static rig x, y;
    const double turn = 6.283185307179586;
    uint64_t s = 1150;
    int i, round;
    place(WHEEL, &s, ROLN_C(0.03125), &x);
    zd_max[0] = zd_max[1] = zd_max[2] = 100;
    x.e.zd[0] = 40, x.e.zd[2] = -30; /* several turns */
    for (round = 0; round < 200; round++) {
        roln_real z[3], zd[3], off;
        memcpy(z, x.e.z, sizeof z), memcpy(zd, x.e.zd, sizeof zd);
        simulate(WHEEL, &x, &s, z, zd, x.y);
        y = x;
        for (i = 0; i < 3; i += 2) {
            off = (roln_real)(turn * (roln_randint(9, &s) - 4));
            y.y[i] += off;
        }
        if (round % 3 == 2) { /* between measurements, too */
            CHECK(tick_of(WHEEL, &x.noise, NULL, x.tau, &x.e) == ROLN_FILTER_MISSING);
            CHECK(tick_of(WHEEL, &y.noise, NULL, y.tau, &y.e) == ROLN_FILTER_MISSING);
        } else {
            CHECK(tick_of(WHEEL, &x.noise, x.y, x.tau, &x.e) == 0 && tick_of(WHEEL, &y.noise, y.y, y.tau, &y.e) == 0);
        }
        for (i = 0; i < 3; i++) {
            BOUND("filter: on any turn, z", apart(i, x.e.z[i], y.e.z[i]), 20 * EPS);
            BOUND("filter: on any turn, zd", fabsl((ld)(x.e.zd[i] - y.e.zd[i])), 400 * EPS);
            CHECK(i == 1 || (x.e.z[i] > -ROLNI_PI && x.e.z[i] <= ROLNI_PI));
        }
        for (i = 0; i < 3; i++) /* of a covariance that stays what it is */
            BOUND("filter: follows turns", apart(i, z[i], x.e.z[i]), 0.01);
    }
}

/* Over the seam by a measurement. */
static void test_seam(void)
{
    static rig x;
    uint64_t s = 1160;
    place(WHEEL, &s, ROLN_C(0.03125), &x);
    x.e.z[0] = ROLN_C(3.140625), x.y[0] = ROLN_C(-3.125);
    CHECK(tick_of(WHEEL, &x.noise, x.y, x.tau, &x.e) == 0);
    BOUND("filter: over the seam", fabsl((ld)(x.e.z[0] - x.y[0])), 0.1);
}

/* ---- what makes no sense ---------------------------------------------------------------------- */

static void test_refused(int k)
{
    static rig x, was;
    const int N = N_OF(k), n = n_OF(k);
    const roln_real wrong[3] = {(roln_real)NAN, (roln_real)INFINITY, -1};
    uint64_t s = 1200 + (uint64_t)k;
    int i, j;
    place(k, &s, ROLN_C(0.015625), &x);
    was = x;
    for (i = 0; i < 8 + loaded; i++)
        for (j = 0; j < 3; j++) {
            roln_noise *const l = &x.noise;
            roln_real *const field[6] = {&l->dt, &l->q, &l->tau, &l->gate, x.q_each + N - 1, x.tau_each + N - 1};
            x = was, x.noise.q_each = i == 4 ? x.q_each : NULL, x.noise.tau_each = i == 5 ? x.tau_each : NULL;
            if (i < 6) *field[i] = wrong[j];
            else if (i == 8) l->load = wrong[j];
            else if (i == 6) x.noise.lost = -1;
            else if (j == 0) x.noise.dt = 0;
            else if (j == 1) x.noise.q = 0;
            else x.noise.q_each = x.q_each, x.q_each[0] = 0;
            CHECK(tick_of(k, &x.noise, x.y, x.tau, &x.e) == (ROLN_FAULT_INPUT | ROLN_FILTER_NONE) && equal(k, &x.e, &was.e));
            CHECK(x.e.f.faults == (ROLN_FAULT_INPUT | ROLN_FILTER_NONE) && x.e.f.valid == 1 && x.e.f.outliers == 0);
        }
    if (k == PUSHED) return; /* midpoint does not always converge */
    x = was, x.tau[F_OF(k) - 1] = (roln_real)NAN;
    CHECK((tick_of(k, &x.noise, x.y, x.tau, &x.e) & ~(uint32_t)ROLN_FAULT_RANGE) == ROLN_FAULT_INPUT);
    tick_of(k, &was.noise, was.y, NULL, &was.e);
    CHECK(equal(k, &x.e, &was.e)); /* as if there were none */
    for (i = 0; i < 2; i++) { /* no range */
        memset(&x.e, 0, sizeof x.e), was.e = x.e;
        if (i == 0) z_max[n - 1] = z_min[n - 1];
        else z_max[n - 1] = 4, zd_max[n - 1] = 0;
        CHECK(tick_of(k, &x.noise, was.y, NULL, &x.e) == (ROLN_FAULT_RANGE | ROLN_FILTER_NONE) && equal(k, &x.e, &was.e));
    }
}

/* ---- a million ticks -------------------------------------------------------------------------- */

/* Everything that may happen at once, and for ever: encoders that fail and glitch, torques that are not finite, a machine that is
   moved, unknown torques far larger than expected, a model that fails. The estimate is finite (tick_of looks), and once the machine
   is good again, so is the estimate. */
static void test_ticks(int k, int ticks)
{
    static rig x;
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), side = side_of(n);
    roln_real z[MAXN], zd[MAXN], y[MAXN], start[2][MAXN], tau[MAXN];
    uint64_t s = 1250 + (uint64_t)k;
    double nees = 0;
    int i, t, good = 0, count = 0;
    place(k, &s, 1, &x);
    for (i = 0; i < N; i++)
        x.tau_each[i] *= ROLN_C(0.125);
    fill(MAXN, 0, x.tau);
    memcpy(z, x.e.z, sizeof z), memcpy(zd, x.e.zd, sizeof zd), memcpy(start[0], z, sizeof z), memcpy(start[1], zd, sizeof zd);
    memset(&x.e, 0, sizeof x.e), memset(burden, 0, sizeof burden), restless = 0;
    x.noise.gate = 6;
    for (t = 0; t < ticks; t++) {
        const int calm = t % 1000 >= 500, event = calm ? 0 : roln_randint(64, &s);
        if (t % 1000 == 0 || !m.of->in_range(&m, z, zd)) good = 0, memcpy(z, start[0], sizeof z), memcpy(zd, start[1], sizeof zd);
        simulate(k, &x, &s, z, zd, y);
        memcpy(tau, x.tau, sizeof tau);
        if (event < 8 && !calm) y[roln_randint(N, &s)] = event < 4 ? (roln_real)NAN : ROLN_C(1e6) * roln_normal(&s);
        if (event == 9) dyadic(n, 1, &s, z);
        if (event == 10) dyadic(n, 8, &s, zd);
        if (event == 11) tau[0] = (roln_real)INFINITY;
        if (event == 12) fill(N, PICK(3e38f, 1e308), y);
        if (event == 13) x.e.zd[0] = PICK(1e38f, 1e300);
        if (event == 15 && loaded) x.e.load[0] = PICK(1e37f, 1e300);
        if (event == 14) fill(F_OF(k), PICK(1e37f, 1e300), tau);
        tick_of(k, &x.noise, event == 8 ? NULL : y, tau, &x.e);
        good = calm ? good + 1 : 0;
        if (good > 100) nees += (double)squared_error(k, &x.e, z, zd) / side, count++;
    }
    BOUND("filter: NEES / side, calm", count > 0 ? nees / count : 0, 1.5);
    CHECK(x.e.f.outliers > 0 && x.e.f.starts > 1);
}

/* ---- one model, with structs of its own ------------------------------------------------------- */

static void test_plain(void)
{
    static plain_params p;
    static plain_filter f, was;
    static rig x;
    uint64_t s = 1350;
    roln_batch b;
    int i;
    place(PLAIN, &s, 1, &x);
    p.slope = plain_model.ae.slope, p.eigenvalue_floor = plain_model.lnn.eigenvalue_floor, p.scale = scale;
    memcpy(p.z_min, z_min, sizeof p.z_min), memcpy(p.z_max, z_max, sizeof p.z_max), memcpy(p.zd_max, zd_max, sizeof p.zd_max);
    memcpy(p.theta, theta_k, sizeof p.theta);
    memset(&x.e, 0, sizeof x.e);
    for (i = 0; i < 5; i++) {
        const uint32_t faults = tick_of(PLAIN, &x.noise, x.y, x.tau, &x.e);
        CHECK(plain_filter_tick(&p, &x.noise, x.y, x.tau, &f,
                                (void *)room_of(plain_called.scratch.filter_tick)) == faults);
        ROOM_KEPT();
        CHECK(same(2, f.s.z, x.e.z) && same(2, f.s.zd, x.e.zd) && same(16, f.F, x.e.F) && f.f.faults == x.e.f.faults);
    }
    memcpy(&was, &f, sizeof f);
    p.slope /= 2;
    CHECK(plain_filter_tick(&p, &x.noise, x.y, x.tau, &f, (void *)spare) == ROLN_FAULT_STATUS);
    was.f.faults |= ROLN_FAULT_STATUS;
    CHECK(memcmp(&f, &was, sizeof f) == 0);
    b = record(PLAIN, &x, &s);
    CHECK(plain_fit_noise(&p, &b, &x.noise, x.q_each, NULL, (void *)spare) == ROLN_E_SHAPE);
    p.slope *= 2;
    CHECK_OK(plain_fit_noise(&p, &b, &x.noise, x.q_each, NULL, (void *)spare));
}

/* NAME_filter_tick and NAME_control with ROLN_LOAD. */
static void test_laden(void)
{
    static laden_params p;
    static laden_filter f;
    static rig x;
    const instance m = of_model(LADEN);
    laden_target r;
    roln_real tau_z[2], by_hand[2];
    const target_at target = {r.z, r.zd, r.zdd, r.kp, r.kd, f.load};
    uint64_t s = 1360;
    int i;
    loaded = 1;
    place(LADEN, &s, 1, &x);
    p.slope = laden_model.ae.slope, p.eigenvalue_floor = laden_model.lnn.eigenvalue_floor, p.scale = scale;
    memcpy(p.z_min, z_min, sizeof p.z_min), memcpy(p.z_max, z_max, sizeof p.z_max), memcpy(p.zd_max, zd_max, sizeof p.zd_max);
    memcpy(p.theta, theta_k, sizeof p.theta);
    memset(&x.e, 0, sizeof x.e), memset(&r, 0, sizeof r);
    CHECK(sizeof f == sizeof f.f + (4 + 2 + 36) * sizeof(roln_real) || sizeof f.f % sizeof(roln_real) > 0);
    for (i = 0; i < 5; i++) {
        const uint32_t faults = tick_of(LADEN, &x.noise, x.y, x.tau, &x.e);
        CHECK(laden_filter_tick(&p, &x.noise, x.y, x.tau, &f,
                                (void *)room_of(laden_called.scratch.filter_tick)) == faults);
        ROOM_KEPT();
        CHECK(same(2, f.s.z, x.e.z) && same(2, f.s.zd, x.e.zd) && same(36, f.F, x.e.F) && same(2, f.load, x.e.load));
    }
    CHECK(largest(2, f.load) > 0);
    r.load = f.load;
    CHECK_OK(laden_control(&p, &f.s, &r, tau_z, (void *)spare));
    CHECK_OK(m.of->control(&m, f.s.z, f.s.zd, &target, by_hand, spare));
    CHECK(same(2, tau_z, by_hand));
    r.load = NULL;
    CHECK_OK(laden_control(&p, &f.s, &r, tau_z, (void *)spare));
    BOUND("load: by NAME_control, eps", fabsl((ld)(tau_z[0] - by_hand[0] - f.load[0])) / EPS, 16);
    loaded = 0;
}

/* A filter that looks ahead by leapfrog has the same bits whatever the integrator of its model; and other ones than by RK4. */
static void test_look(void)
{
    static rig leap, look, own;
    uint64_t s = 870;
    int t;
    place(LADEN, &s, ROLN_C(0.03125), &leap);
    look = own = leap;
    for (t = 0; t < 8; t++) {
        const rig *const x = &leap;
        const instance as[3] = {filled(&unladen_leap_called, LADEN), filled(&unladen_look_called, LADEN),
                                filled(&unladen_called, LADEN)};
        rig *const of[3] = {&leap, &look, &own};
        int i;
        for (i = 0; i < 3; i++) {
            const filter_at to = {&of[i]->e.f, of[i]->e.z, of[i]->e.zd, of[i]->e.F, of[i]->e.load, of[i]->e.zdd};
            as[i].of->filter_tick(&as[i], &x->noise, x->y, x->tau, &to, room_of(as[i].of->scratch.filter_tick));
            ROOM_KEPT();
        }
        CHECK(memcmp(&leap.e, &look.e, sizeof leap.e) == 0);
    }
    CHECK(memcmp(leap.e.z, own.e.z, sizeof leap.e.z) != 0);
}

/* Led by its model alone, a filter of leapfrog is off from the motion by a quarter at half the step, also where forces depend on
   the velocity. zdd is that of the last step, and 0 at a start. */
static void test_order(void)
{
    enum { SIZES = 4, FINE = 16, TICKS = 4 };
    const instance m = of_model(LADEN), leap = filled(&unladen_leap_called, LADEN);
    static rig x;
    ld off[SIZES] = {0};
    uint64_t s = 871;
    int k, t, i;
    place(LADEN, &s, ROLN_C(0.03125), &x);
    x.noise.lost = 1000;
    x.e.zd[0] = 2, x.e.zd[1] = -2;
    for (k = 0; k < SIZES; k++, x.noise.dt /= 2) {
        estimate e = x.e;
        roln_real z[2], zd[2], before[2] = {0};
        const filter_at to = {&e.f, e.z, e.zd, e.F, e.load, e.zdd};
        memcpy(z, e.z, sizeof z), memcpy(zd, e.zd, sizeof zd);
        for (t = 0; t < TICKS << k; t++) {
            memcpy(before, e.zd, sizeof before);
            CHECK(leap.of->filter_tick(&leap, &x.noise, NULL, x.tau, &to, room_of(leap.of->scratch.filter_tick)) ==
                  ROLN_FILTER_MISSING);
            ROOM_KEPT();
            for (i = 0; i < FINE; i++)
                CHECK_OK(m.of->push(&m, z, zd, x.tau, NULL, x.noise.dt / FINE, spare));
        }
        for (i = 0; i < 2; i++) {
            off[k] += powl((ld)e.z[i] - (ld)z[i], 2) + powl((ld)e.zd[i] - (ld)zd[i], 2);
            CHECK_NEAR(e.zdd[i], (e.zd[i] - before[i]) / x.noise.dt, 1e-3);
        }
        e.f.valid = 0, fill(2, 7, e.zdd);
        CHECK(leap.of->filter_tick(&leap, &x.noise, x.y, x.tau, &to, room_of(leap.of->scratch.filter_tick)) == ROLN_FILTER_START);
        CHECK(all(2, e.zdd, 0));
    }
    for (k = 0; k + 1 < SIZES; k++)
        BOUND("filter of leapfrog: half the step", fabsl(sqrtl(off[k] / off[k + 1]) / 4 - 1), 0.25);
}

void TEST_NAME(filter)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        for (leaps = 1, loaded = 0; loaded < 2; loaded++) {
            test_tick(k);
            test_steady(k);
            test_consistent(k);
        }
        leaps = 0;
        for (loaded = 0; loaded < 2; loaded++) {
            test_tick(k);
            test_steady(k);
            test_consistent(k);
            test_gate(k);
            test_starts(k);
            test_refused(k);
        }
        loaded = 1;
        test_push(k);
        test_held(k);
        test_guarded(k);
        test_unladen(k);
        loaded = 0;
    }
    test_look();
    test_order();
    test_turns();
    test_seam();
    test_ticks(DELAN, check_sample ? 20000 : 1000000);
    test_ticks(WHEEL, 10000);
    test_ticks(CHART, 10000);
    test_plain();
    test_laden();
    loaded = 1;
    test_ticks(DELAN, 10000);
    loaded = 0;
    print_bounds();
}
