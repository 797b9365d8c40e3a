/* SPDX-License-Identifier: MIT */
/* observed.h - the observer (NAME_observer_tick, NAME_fit_observer) of one model, for test_observer.c. Include behind the model,
   with OBSERVED(x) = NAME_x; OBSERVED_SLIDE(p, zd): velocities 4 v beyond those at which dry friction sets in; OBSERVED_LEAPS: 1
   if its observer takes steps of leapfrog, else those of NAME_step; OBSERVED_LAST(o): the acceleration of the last step. The model
   must have steps of leapfrog. Defines NAME_test_observer(). */
#define T__(x) OBSERVED(x)
#define T_(x) T__(test_##x)

/* The unit of the last joint: with ROLN_SCALE each behind slope, eigenvalue_floor and scale.q, .t, .m, else that of all. */
static roln_real *T_(unit)(OBSERVED(params) *p)
{
    return OBSERVED(own) ? (roln_real *)(void *)p + 5 + OBSERVED(N) - 1 : &p->scale.q;
}

/* What a torque of one unit of all joints is at joint i. */
static roln_real T_(torque)(const OBSERVED(params) *p, int i)
{
    OBSERVED(params) same_units = *p;
    return OBSERVED(own) && i == OBSERVED(N) - 1 ? 1 / *T_(unit)(&same_units) : 1;
}

/* A model of random weights, a range, and noise of each joint. */
static roln_noise T_(model)(OBSERVED(params) *p, roln_real *q_each)
{
    static OBSERVED(init_work) w;
    const roln_noise noise = {.dt = ROLN_C(0.0009765625), .q = 1, .tau = ROLN_C(0.25), .lost = 3, .q_each = q_each};
    uint64_t seed = 5;
    int i;
    CHECK_OK(OBSERVED(init)(p, &seed, &w));
    p->scale.q = OBSERVED(angles) ? 1 : 2, p->scale.t = ROLN_C(0.5), p->scale.m = ROLN_C(0.25);
    if (OBSERVED(own)) *T_(unit)(p) = ROLN_C(0.5);
    for (i = 0; i < OBSERVED(n); i++)
        p->z_min[i] = -1, p->z_max[i] = 1, p->zd_max[i] = 4;
    for (i = 0; i < OBSERVED(N); i++)
        q_each[i] = ROLN_C(0.0009765625) * (roln_real)(1 + i % 2);
    return noise;
}

/* q and J at z. */
static void T_(pose)(const OBSERVED(params) *p, const roln_real *z, ld *q, ld *J)
{
    static OBSERVED(decode_work) w;
    OBSERVED(latent) s;
    OBSERVED(state) x;
    int i, j;
    memcpy(s.z, z, sizeof s.z);
    for (j = 0; j < OBSERVED(n); j++) {
        for (i = 0; i < OBSERVED(n); i++)
            s.zd[i] = i == j;
        CHECK_OK(OBSERVED(decode)(p, &s, &x, &w));
        for (i = 0; i < OBSERVED(N); i++)
            q[i] = (ld)x.q[i], J[i * OBSERVED(n) + j] = (ld)x.qd[i];
    }
}

/* The largest deviations e [N] so far of what is expected of each joint, from P behind the last measurement. */
static void T_(expected)(const roln_noise *noise, const roln_real *A, const ld *P, const ld *J, const ld *G, ld *e)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), n2 = 2 * n };
    int i, j, k, l;
    for (l = 0; l < N; l++) { /* J_l (A P A^T + G G^T) J_l^T + r^2 */
        ld sum = (ld)noise->q_each[l] * (ld)noise->q_each[l], row[n2] = {0};
        for (j = 0; j < n2; j++)
            for (i = 0; i < n; i++)
                row[j] += J[l * n + i] * (ld)A[i * n2 + j];
        for (i = 0; i < n2; i++)
            for (j = 0; j < n2; j++)
                sum += row[i] * P[i * n2 + j] * row[j];
        for (k = 0; k < N; k++) {
            ld g = 0;
            for (i = 0; i < n; i++)
                g += J[l * n + i] * G[i * N + k];
            sum += g * g;
        }
        e[l] = fmaxl(e[l], sqrtl(sum));
    }
}

/* Columns of z of the covariance that the filter's equations settle at, by ten thousand ticks of them in long double, and the
   deviation of what is expected of each joint. */
static void T_(settled)(const OBSERVED(params) *p, const roln_noise *noise, const roln_real *z, ld *columns, ld *e)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), n2 = 2 * n };
    static OBSERVED(linear_work) w;
    static OBSERVED(dynamics_work) v;
    OBSERVED(equation) terms;
    OBSERVED(latent) s;
    OBSERVED(jacobian) step;
    roln_real zero[OBSERVED(force_size)] = {0};
    const roln_real *const A = step.A;
    ld q[N], J[N * n], G[n2 * N] = {0}, P[n2 * n2] = {0}, B[n2 * n2], M[n * n], column[n];
    int t, i, j, k, l;
    memcpy(s.z, z, sizeof s.z), memset(s.zd, 0, sizeof s.zd);
    T_(pose)(p, z, q, J);
    CHECK_OK(OBSERVED(dynamics)(p, &s, &terms, &v));
    for (l = 0; l < N; l++) {
        for (i = 0; i < n; i++)
            column[i] = J[l * n + i] * (ld)(noise->tau * T_(torque)(p, l));
        for (i = 0; i < n * n; i++)
            M[i] = (ld)terms.M[i];
        t_solve(n, 1, M, column);
        for (i = 0; i < n; i++)
            G[i * N + l] = (ld)noise->dt * (ld)noise->dt / 2 * column[i], G[(n + i) * N + l] = (ld)noise->dt * column[i];
    }
    OBSERVED_SLIDE(p, s.zd);
    CHECK_OK(OBSERVED(linear)(p, &s, zero, noise->dt, &step, &w));
    for (t = 0; t < 10000; t++) {
        for (i = 0; i < n2; i++) /* P = A P A^T + G G^T */
            for (j = 0; j < n2; j++)
                for (B[i * n2 + j] = 0, k = 0; k < n2; k++)
                    B[i * n2 + j] += (ld)A[i * n2 + k] * P[k * n2 + j];
        for (i = 0; i < n2; i++)
            for (j = 0; j < n2; j++) {
                ld sum = 0;
                for (k = 0; k < n2; k++)
                    sum += B[i * n2 + k] * (ld)A[j * n2 + k];
                for (k = 0; k < N; k++)
                    sum += G[i * N + k] * G[j * N + k];
                P[i * n2 + j] = j < i ? P[j * n2 + i] : sum; /* what is not symmetric would grow */
            }
        for (l = 0; l < N; l++) { /* one joint after the other: P -= P J_l^T J_l P / (J_l P J_l^T + r^2) */
            const ld r = (ld)noise->q_each[l];
            ld PJ[n2] = {0}, sum = r * r;
            for (i = 0; i < n2; i++)
                for (k = 0; k < n; k++)
                    PJ[i] += P[i * n2 + k] * J[l * n + k];
            for (k = 0; k < n; k++)
                sum += J[l * n + k] * PJ[k];
            for (i = 0; i < n2; i++)
                for (j = 0; j < n2; j++)
                    P[i * n2 + j] -= PJ[i] * PJ[j] / sum;
        }
    }
    for (i = 0; i < n2; i++)
        for (k = 0; k < n; k++)
            columns[i * n + k] = P[i * n2 + k];
    T_(expected)(noise, A, P, J, G, e);
}

/* Recordings: joints of a state that swings through the range. */
static roln_batch T_(recorded)(const OBSERVED(params) *p, roln_real *q)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), SAMPLES = 200 };
    const roln_batch b = {2, SAMPLES / 2 - 1, 1, NULL, q, NULL, NULL, NULL};
    roln_real z[n];
    ld x[N], J[N * n];
    int t, i;
    for (t = 0; t < SAMPLES; t++) {
        for (i = 0; i < n; i++)
            z[i] = (roln_real)(0.8L * sinl(0.07L * t * (1 + 0.6L * i)));
        T_(pose)(p, z, x, J);
        for (i = 0; i < N; i++)
            q[t * N + i] = t % 40 == 7 && i == 0 ? (roln_real)NAN : (roln_real)x[i];
    }
    return b;
}

/* Batches without a stride, and noise whose square overflows. */
static void T_(refused)(const OBSERVED(params) *p, const roln_noise *noise, const roln_batch *b)
{
    static OBSERVED(fit_observer_work) w;
    static OBSERVED(observer_gains) g, was;
    roln_batch bad = *b;
    roln_noise wrong = *noise;
    int k;
    for (bad.stride = -1; bad.stride < 1; bad.stride++)
        CHECK(OBSERVED(fit_observer)(p, noise, &bad, &g, &w) == ROLN_E_LENGTH && memcmp(&g, &was, sizeof was) == 0);
    for (k = 0; k < 64; k++) {
        wrong.q_each = NULL, wrong.q = (sizeof(roln_real) > 4 ? (roln_real)1e154 : (roln_real)1.5e19) * (1 + (roln_real)(k % 8));
        wrong.tau = noise->tau * (roln_real)(1 << k / 8);
        memset(&g, 0, sizeof g);
        CHECK(OBSERVED(fit_observer)(p, &wrong, b, &g, &w) != ROLN_OK ? memcmp(&g, &was, sizeof was) == 0
                                                                      : roln_all_finite(OBSERVED(N), g.e));
    }
}

/* Gains at every state that was chosen; what is refused leaves everything as it was. */
static void T_(fit)(const OBSERVED(params) *p, const roln_noise *noise, const roln_batch *b, OBSERVED(observer_gains) *g)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), CENTRES = OBSERVED(centres) };
    static OBSERVED(fit_observer_work) w;
    static OBSERVED(observer_gains) was;
    static OBSERVED(params) other;
    roln_batch bad = *b;
    roln_noise wrong = *noise;
    roln_noise start = *noise;
    ld P[2 * n * n], P1[2 * n * n], e[N] = {0}, none[N] = {0}, settle = 0, apart = 1e9L;
    int c, d, i;
    memset(g, 7, sizeof *g), was = *g;
#define REFUSED(status, call) CHECK((call) == (status)), CHECK(memcmp(g, &was, sizeof was) == 0)
    bad.count = 0;
    REFUSED(ROLN_E_LENGTH, OBSERVED(fit_observer)(p, noise, &bad, g, &w));
    bad.count = 1, bad.steps = -1;
    REFUSED(ROLN_E_LENGTH, OBSERVED(fit_observer)(p, noise, &bad, g, &w));
    T_(refused)(p, noise, b);
    wrong.dt = 0;
    REFUSED(ROLN_E_RANGE, OBSERVED(fit_observer)(p, &wrong, b, g, &w));
    wrong = *noise, wrong.tau = 0;
    if (OBSERVED(fit_observer)(p, &wrong, b, g, &w) != ROLN_OK) CHECK(memcmp(g, &was, sizeof was) == 0);
    *g = was; /* where no torque is unknown, damping may settle it */
    other = *p, other.z_max[n - 1] = other.z_min[n - 1];
    REFUSED(ROLN_E_RANGE, OBSERVED(fit_observer)(&other, noise, b, g, &w));
    other = *p, other.slope = 2;
    REFUSED(ROLN_E_SHAPE, OBSERVED(fit_observer)(&other, noise, b, g, &w));
    other = *p, other.theta[OBSERVED(ae_size) + 1] = (roln_real)NAN; /* the step fails */
    CHECK(OBSERVED(fit_observer)(&other, noise, b, g, &w) != ROLN_OK && memcmp(g, &was, sizeof was) == 0);
    bad = *b, bad.count = 1, bad.steps = 0, bad.start = (const int[]){7};
    REFUSED(ROLN_E_NOT_FINITE, OBSERVED(fit_observer)(p, noise, &bad, g, &w));
#undef REFUSED
    CHECK_OK(OBSERVED(fit_observer)(p, noise, b, g, &w));
    CHECK(same(1, &g->dt, &noise->dt) && same(1, &g->gate, &noise->gate) && g->lost == noise->lost && same(N, g->q, noise->q_each));
    for (c = 0; c < CENTRES; c++) {
        ld worst = 0, size = 0, z = 0, zd = 0;
        T_(settled)(p, noise, g->z[c], P, e);
        start.tau = 64 * noise->tau;
        T_(settled)(p, &start, g->z[c], P1, none);
        for (i = 0; i < n; i++)
            z += P1[i * (n + 1)], zd += P1[(n + i) * n + i];
        settle = fmaxl(settle, sqrtl(8) * z / (zd * (ld)noise->dt));
        for (i = 0; i < 2 * n * n; i++)
            worst = fmaxl(worst, fabsl((ld)g->P[1][c][i] - P1[i])), size = fmaxl(size, fabsl(P1[i]));
        BOUND("observer: a settled filter, of a start", worst / size, PICK(5e-5, 1e-11));
        worst = size = 0;
        for (i = 0; i < 2 * n * n; i++) {
            worst = fmaxl(worst, fabsl((ld)g->P[0][c][i] - P[i])), size = fmaxl(size, fabsl(P[i]));
        }
        BOUND("observer: a settled filter", worst / size, PICK(5e-5, 1e-11));
        for (i = 0; i < n; i++)
            CHECK(fabs((double)g->z[c][i]) <= 0.81);
        for (d = 0; d < c; d++)
            apart = fminl(apart, furthest(n, g->z[c], g->z[d]));
    }
    CHECK(apart > 0.05L);
    BOUND("observer: settles", fabsl((ld)g->settle / settle - 1), PICK(5e-5, 1e-11));
    for (i = 0; i < N; i++)
        BOUND("observer: what is expected", fabsl((ld)g->e[i] / e[i] - 1), PICK(1e-4, 1e-11));
}

/* One deviation for all joints, or the same for each: the same gains. Whatever noise there is, gains are finite, or refused. */
static void T_(noises)(const OBSERVED(params) *p, const roln_noise *noise, const roln_batch *b, const OBSERVED(observer_gains) *g)
{
    enum { N = OBSERVED(N), SIZES = 9 };
    static const roln_real size[SIZES] = {PICK(1e-37f, 1e-300), PICK(1e-30f, 1e-200), PICK(1e-19f, 1e-150), ROLN_C(1e-9), 1,
                                          ROLN_C(1e9), PICK(1e18f, 1e150), PICK(1e30f, 1e200), PICK(1e37f, 1e300)};
    static OBSERVED(fit_observer_work) w;
    static OBSERVED(observer_gains) one, each;
    roln_real q_each[N], tau_each[N];
    roln_noise other = *noise;
    int k, l, m, i, good = 0, bad = 0;
    for (i = 0; i < N; i++)
        tau_each[i] = noise->tau * T_(torque)(p, i);
    other.tau_each = tau_each;
    CHECK_OK(OBSERVED(fit_observer)(p, &other, b, &each, &w));
    CHECK(memcmp(g, &each, sizeof each) == 0);
    other = *noise, other.q = noise->q_each[0], other.q_each = NULL;
    CHECK_OK(OBSERVED(fit_observer)(p, &other, b, &one, &w));
    for (i = 0; i < N; i++)
        q_each[i] = other.q;
    other.q_each = q_each, other.q = 1;
    CHECK_OK(OBSERVED(fit_observer)(p, &other, b, &each, &w));
    CHECK(memcmp(&one, &each, sizeof one) == 0);
    for (k = 0; k < SIZES; k++)
        for (l = 0; l < SIZES; l++)
            for (m = 0; m < SIZES; m++) {
                roln_status st;
                other.q_each = NULL, other.q = size[k], other.tau = size[l], other.dt = noise->dt * size[m];
                st = OBSERVED(fit_observer)(p, &other, b, &one, &w);
                CHECK(st != ROLN_OK || (roln_all_finite(sizeof one.P / sizeof(roln_real), one.P[0][0]) && roln_finite(one.settle)));
                good += st == ROLN_OK, bad += st != ROLN_OK;
            }
    CHECK(good > 10 && bad > 10);
}

/* One tick: a step, and K J^T R^-1 e of the joints that are measured, K the mean of P with weights 1 / (d^2 + 1e-4)^2. */
static void T_(tick)(const OBSERVED(params) *p, const OBSERVED(observer_gains) *g)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), F = OBSERVED(force_size) };
    static OBSERVED(observer_tick_work) w;
    static OBSERVED(step_work) v;
    OBSERVED(observer) o;
    uint64_t seed = 9;
    int round, i, j, c;
    for (round = 0; round < 40; round++) {
        const int missing = round % 3 == 2 ? round % N : -1;
        roln_real y[N], tau[F], at[2 * n];
        OBSERVED(latent) s;
        ld q[N], J[N * n], b[n] = {0}, x[2 * n], zdd[n], sum = 0, K[2 * n * n] = {0}, worst = 0, most = 0, begin;
        memset(&o, 0, sizeof o);
        o.age = round % 2 ? 0 : (roln_real)(round * (int)g->settle / 8);
        begin = o.age + 1 > g->settle ? powl((ld)g->settle / ((ld)o.age + 1), 2) : 1;
        dyadic(n, ROLN_C(0.75), &seed, o.s.z), dyadic(n, 2, &seed, o.s.zd), dyadic(F, 1, &seed, tau);
        if (round > 1 && OBSERVED_LEAPS) dyadic(n, 4, &seed, OBSERVED_LAST(o));
        o.f.valid = 1, o.f.starts = 1, s = o.s;
        for (i = 0; i < n; i++) /* forces half a step ahead */
            s.z[i] -= g->dt * g->dt / 4 * OBSERVED_LAST(o)[i], s.zd[i] += g->dt / 2 * OBSERVED_LAST(o)[i];
        CHECK_OK(OBSERVED(step)(p, &s, round % 4 ? tau : NULL, g->dt, &v));
        for (i = 0; i < n; i++) {
            s.z[i] -= g->dt * g->dt / 4 * OBSERVED_LAST(o)[i], s.zd[i] -= g->dt / 2 * OBSERVED_LAST(o)[i];
            zdd[i] = ((ld)s.zd[i] - (ld)o.s.zd[i]) / (ld)g->dt;
        }
        T_(pose)(p, s.z, q, J);
        memcpy(at, s.z, sizeof s.z), memcpy(at + n, s.zd, sizeof s.zd);
        for (i = 0; i < N; i++) {
            y[i] = i == missing ? (roln_real)NAN : (roln_real)q[i] + ROLN_C(0.003) * roln_normal(&seed);
            for (j = 0; j < n && i != missing; j++)
                b[j] += J[i * n + j] * ((ld)y[i] - q[i]) / ((ld)g->q[i] * (ld)g->q[i]);
        }
        for (c = 0; c < OBSERVED(centres); c++) {
            ld d = 1e-4L;
            for (i = 0; i < n; i++)
                d += ((ld)s.z[i] - (ld)g->z[c][i]) * ((ld)s.z[i] - (ld)g->z[c][i]) / 4;
            sum += 1 / (d * d);
            for (i = 0; i < 2 * n * n; i++)
                K[i] += ((ld)g->P[0][c][i] * (1 - begin) + (ld)g->P[1][c][i] * begin) / (d * d);
        }
        for (i = 0; i < 2 * n; i++) {
            ld dx = 0;
            for (j = 0; j < n; j++)
                dx += K[i * n + j] / sum * b[j];
            x[i] = (ld)at[i] + dx;
            most = fmaxl(most, fabsl(x[i]));
        }
        CHECK(OBSERVED(observer_tick)(p, g, y, round % 4 ? tau : NULL, &o, &w) == (missing >= 0 ? ROLN_FILTER_MISSING : 0));
        memcpy(at, o.s.z, sizeof o.s.z), memcpy(at + n, o.s.zd, sizeof o.s.zd);
        for (i = 0; i < 2 * n; i++)
            worst = fmaxl(worst, fabsl((ld)at[i] - x[i]));
        BOUND("observer: a tick", worst / most, PICK(1e-3, 1e-11));
        for (worst = 0, i = 0; i < n && OBSERVED_LEAPS; i++)
            worst = fmaxl(worst, fabsl((ld)OBSERVED_LAST(o)[i] - zdd[i]));
        BOUND("observer: the acceleration of a tick", worst, PICK(1e-2, 1e-10));
        CHECK(o.f.used == N - (missing >= 0) && o.f.outliers == 0 && o.f.valid && o.f.nis > 0);
    }
}

/* Starts after a start: joints that are missing are those of the last estimate. A step, a pose or an encoding that fails. */
static void T_(again)(const OBSERVED(params) *p, const OBSERVED(observer_gains) *g)
{
    enum { n = OBSERVED(n), N = OBSERVED(N) };
    static OBSERVED(observer_tick_work) w;
    static OBSERVED(params) other;
    static OBSERVED(observer_gains) sure;
    const roln_real top = PICK(3e38f, 1e308);
    OBSERVED(observer) o, lost;
    roln_real y[N], z[n] = {0};
    ld q[N], J[N * n];
    int i;
    memset(&lost, 0, sizeof lost);
    z[0] = ROLN_C(0.25), lost.s.z[0] = ROLN_C(0.25), lost.f.starts = 1;
    T_(pose)(p, z, q, J);
    for (i = 0; i < N; i++)
        y[i] = (roln_real)q[i];
    y[N - 1] = (roln_real)NAN, o = lost;
    CHECK(OBSERVED(observer_tick)(p, g, y, NULL, &o, &w) == (ROLN_FILTER_MISSING | ROLN_FILTER_START) && o.f.valid);
    BOUND("observer: starts at what is measured and what was estimated", furthest(n, o.s.z, z), PICK(1e-5, 1e-13));
    o = lost, o.s.z[0] = (roln_real)NAN;
    CHECK(OBSERVED(observer_tick)(p, g, y, NULL, &o, &w) == (ROLN_FILTER_MISSING | ROLN_FILTER_NONE | ROLN_FAULT_STATUS));
    y[N - 1] = top, o = lost, other = *p, *T_(unit)(&other) = ROLN_C(1e-6);
    CHECK(OBSERVED(observer_tick)(&other, g, y, NULL, &o, &w) == (ROLN_FILTER_NONE | ROLN_FAULT_STATUS));
    y[N - 1] = (roln_real)q[N - 1], o = lost, o.f.valid = 1, other = *p, other.theta[OBSERVED(ae_size) + 1] = (roln_real)NAN;
    CHECK(OBSERVED(observer_tick)(&other, g, y, NULL, &o, &w) == (ROLN_FAULT_STATUS | ROLN_FILTER_START));
    o = lost, o.f.valid = 1, fill(n, 4, o.s.z), other = *p, *T_(unit)(&other) = top;
    CHECK((OBSERVED(observer_tick)(&other, g, y, NULL, &o, &w) & ROLN_FAULT_STATUS) != 0);
    o = lost, o.f.valid = 1, y[0] += ROLN_C(0.5);
    sure = *g, sure.gate = 0, sure.e[0] = PICK(1e-30f, 1e-300); /* its nis would be infinite */
    CHECK(OBSERVED(observer_tick)(p, &sure, y, NULL, &o, &w) == (ROLN_FAULT_STATUS | ROLN_FILTER_START) && all(1, &o.f.nis, 0));
}

/* A million ticks after a start the gate is closed, however long the gains take to settle. */
static void T_(late)(const OBSERVED(params) *p, const OBSERVED(observer_gains) *with, const roln_real *y, const roln_real *tau,
                     OBSERVED(observer) o)
{
    static OBSERVED(observer_tick_work) w;
    OBSERVED(observer_gains) g = *with;
    o.age = 1000000, g.settle = 40000;
    CHECK((OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) & ROLN_FILTER_OUTLIER) && o.f.used == OBSERVED(N) - 1);
}

/* Gains that make no sense: nothing is done. */
static void T_(wrong_gains)(const OBSERVED(params) *p, const OBSERVED(observer_gains) *with, const roln_real *y,
                            const roln_real *tau, OBSERVED(observer) *o)
{
    enum { N = OBSERVED(N) };
    static OBSERVED(observer_tick_work) w;
    const OBSERVED(observer) was = *o;
    OBSERVED(observer_gains) g;
    int i;
    for (i = 0; i < 11; i++) { /* 8, 9: the square of q is no number, or 0 */
        roln_real *const wrong[10] = {&g.dt, &g.gate, &g.q[N - 1], &g.e[0],     &g.settle,
                                      &g.dt, &g.q[0], &g.e[N - 1], &g.q[N - 1], &g.q[N - 1]};
        const roln_real square = PICK(ROLN_C(1e30), ROLN_C(1e200));
        g = *with;
        if (i < 10) *wrong[i] = i < 5 ? -1 : i < 8 ? (roln_real)INFINITY : i < 9 ? square : 1 / square;
        else g.lost = -1;
        CHECK(OBSERVED(observer_tick)(p, &g, y, tau, o, &w) == (ROLN_FAULT_INPUT | ROLN_FILTER_NONE) && o->f.valid);
        CHECK(memcmp(&was.s, &o->s, sizeof o->s) == 0);
    }
}

/* Faults as those of the filter: start, gap, outliers, what is not finite, settings; the estimate stays finite. */
static void T_(faults)(const OBSERVED(params) *p, const OBSERVED(observer_gains) *with)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), F = OBSERVED(force_size) };
    static OBSERVED(observer_tick_work) w;
    static OBSERVED(params) other;
    OBSERVED(observer_gains) g = *with;
    OBSERVED(observer) o, was;
    roln_real y[N], tau[F], z[n] = {0};
    ld q[N], J[N * n];
    int i, t;
    memset(&o, 0, sizeof o), z[0] = ROLN_C(0.25);
    T_(pose)(p, z, q, J);
    for (i = 0; i < N; i++)
        y[i] = (roln_real)q[i];
    fill(F, 0, tau);
    CHECK(OBSERVED(observer_tick)(p, &g, NULL, tau, &o, &w) == (ROLN_FILTER_MISSING | ROLN_FILTER_NONE) && !o.f.valid);
    y[0] = (roln_real)NAN;
    CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == (ROLN_FILTER_MISSING | ROLN_FILTER_NONE) && !o.f.valid);
    y[0] = (roln_real)q[0], other = *p, other.z_max[0] = other.z_min[0];
    CHECK(OBSERVED(observer_tick)(&other, &g, y, tau, &o, &w) == (ROLN_FAULT_RANGE | ROLN_FILTER_NONE) && !o.f.valid);
    other = *p, other.zd_max[n - 1] = 0;
    CHECK(OBSERVED(observer_tick)(&other, &g, y, tau, &o, &w) == (ROLN_FAULT_RANGE | ROLN_FILTER_NONE) && !o.f.valid);
    CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == ROLN_FILTER_START && o.f.valid && o.f.starts == 1 && o.f.used == N);
    BOUND("observer: starts at the pose", furthest(n, o.s.z, z), PICK(1e-5, 1e-13));
    CHECK(all(n, o.s.zd, 0) && all(n, OBSERVED_LAST(o), 0));
    CHECK(OBSERVED(observer_tick)(p, &g, NULL, tau, &o, &w) == ROLN_FILTER_MISSING && o.f.used == 0 && o.f.valid);
    tau[F - 1] = (roln_real)NAN;
    CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == ROLN_FAULT_INPUT && o.f.valid);
    tau[F - 1] = 0, o.f.faults = 0, was = o, other = *p, other.slope = 2;
    CHECK(OBSERVED(observer_tick)(&other, &g, y, tau, &o, &w) == ROLN_FAULT_STATUS && o.f.faults == ROLN_FAULT_STATUS);
    T_(wrong_gains)(p, with, y, tau, &o);
    g = *with, g.gate = 6;
    o.age = 32 * g.settle + 1, was = o;
    if (N > n) {
        y[0] += 40 * g.e[0];
        CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == ROLN_FILTER_OUTLIER && o.f.used == N - 1 && o.f.outliers == 1);
        CHECK(o.f.lost == 0);
        T_(late)(p, &g, y, tau, was);
        o = was, o.age = 0; /* the gate is open at first */
        CHECK((OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) & ROLN_FILTER_OUTLIER) == 0 && o.f.used == N && o.age <= 1);
        o = was;
    }
    for (i = N > n; i < N; i++)
        y[i] += 40 * g.e[i];
    for (t = 0; t < g.lost; t++)
        CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == ROLN_FILTER_OUTLIER && o.f.lost == t + 1 && o.f.used == 0);
    CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == (ROLN_FILTER_OUTLIER | ROLN_FILTER_START) && o.f.starts == 2);
    CHECK(all(1, &o.age, 0));
    g = *with, g.P[0][0][0] = (roln_real)NAN; /* gains that are damaged: it starts again */
    CHECK(OBSERVED(observer_tick)(p, &g, y, tau, &o, &w) == (ROLN_FAULT_STATUS | ROLN_FILTER_START) && roln_all_finite(n, o.s.zd));
    fill(N, ROLN_C(1e30), y); /* far out of range: once more */
    CHECK((OBSERVED(observer_tick)(p, with, y, tau, &o, &w) & ROLN_FAULT_STATUS) != 0 && roln_all_finite(n, o.s.z));
    T_(again)(p, with);
}

/* Along a motion under unknown torques with noise of encoders: the root of the mean squares of errors of zd and z, of the observer
   beside those of the filter. */
static void T_(beside)(const OBSERVED(params) *p, const roln_noise *noise, const OBSERVED(observer_gains) *g)
{
    enum { n = OBSERVED(n), N = OBSERVED(N), F = OBSERVED(force_size), TICKS = 3000, SETTLED = 1000 };
    static OBSERVED(observer_tick_work) w;
    static OBSERVED(filter_tick_work) v;
    static OBSERVED(step_work) u;
    static OBSERVED(filter) f;
    OBSERVED(observer) o;
    OBSERVED(latent) s;
    roln_real tau[F], acts[F], y[N];
    ld q[N], J[N * n], sum[2][2] = {{0}};
    uint64_t seed = 17;
    int t, i;
    memset(&f, 0, sizeof f), memset(&o, 0, sizeof o);
    for (i = 0; i < n; i++)
        s.z[i] = ROLN_C(0.25), s.zd[i] = 0;
    for (t = 0; t < TICKS; t++) {
        T_(pose)(p, s.z, q, J);
        for (i = 0; i < N; i++)
            y[i] = (roln_real)q[i] + noise->q_each[i] * roln_normal(&seed);
        OBSERVED(observer_tick)(p, g, y, tau, &o, &w);
        OBSERVED(filter_tick)(p, noise, y, tau, &f, &v);
        CHECK(o.f.valid && f.f.valid && o.f.starts == 1);
        for (i = 0; i < n && t >= SETTLED; i++) {
            sum[0][0] += powl((ld)(o.s.z[i] - s.z[i]), 2), sum[0][1] += powl((ld)(o.s.zd[i] - s.zd[i]), 2);
            sum[1][0] += powl((ld)(f.s.z[i] - s.z[i]), 2), sum[1][1] += powl((ld)(f.s.zd[i] - s.zd[i]), 2);
        }
        for (i = 0; i < F; i++) {
            tau[i] = (roln_real)(0.3L * sinl(0.003L * t * (1 + 0.3L * i))) - (F == n ? (s.z[i] + s.zd[i]) / 4 : 0);
            acts[i] = tau[i] + noise->tau * roln_normal(&seed);
        }
        CHECK_OK(OBSERVED(step)(p, &s, acts, noise->dt, &u));
    }
    BOUND("observer beside the filter: z", sqrtl(sum[0][0] / sum[1][0]), 1.1);
    BOUND("observer beside the filter: zd", sqrtl(sum[0][1] / sum[1][1]), 1.1);
}

static void T_(observer)(void)
{
    static OBSERVED(params) p;
    static OBSERVED(observer_gains) g;
    static OBSERVED(fit_observer_work) w;
    static roln_real q[200 * OBSERVED(N)];
    roln_real q_each[OBSERVED(N)];
    const roln_noise noise = T_(model)(&p, q_each);
    const roln_batch b = T_(recorded)(&p, q);
    if (OBSERVED_LEAPS) T_(fit)(&p, &noise, &b, &g);
    else CHECK_OK(OBSERVED(fit_observer)(&p, &noise, &b, &g, &w)); /* the twin would need the model without ROLN_STICTION */
    T_(noises)(&p, &noise, &b, &g);
    T_(tick)(&p, &g);
    T_(faults)(&p, &g);
    T_(beside)(&p, &noise, &g);
}
#undef T_
#undef T__
