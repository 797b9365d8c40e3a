/* SPDX-License-Identifier: MIT */
/* test_latent.c - the latent models of latent.c: derivatives against central differences, the equations they promise against
   differences of their own H and c, and that they learn motions known in closed form by newton.c. Both precisions in one program,
   so the public names carry the precision. */
#include "../unit/check.h"

#define latent_new TEST_NAME(latent_new)
#define latent_free TEST_NAME(latent_free)
#define latent_params TEST_NAME(latent_params)
#define latent_theta TEST_NAME(latent_theta)
#define latent_rate TEST_NAME(latent_rate)
#define latent_bwd TEST_NAME(latent_bwd)
#define latent_extra TEST_NAME(latent_extra)
#define latent_energy TEST_NAME(latent_energy)
#define cpu_seconds TEST_NAME(cpu_seconds)
#define newton_new TEST_NAME(newton_new)
#define newton_free TEST_NAME(newton_free)
#define newton_run TEST_NAME(newton_run)
#define newton_mean TEST_NAME(newton_mean)
#define picks_open TEST_NAME(picks_open)
#define picks_close TEST_NAME(picks_close)
#define picks_draw TEST_NAME(picks_draw)
#define newton_balance TEST_NAME(newton_balance)
#include "latent.c"
#include "newton.c"

void test_latent_f32(void);
void test_latent_f64(void);

#ifdef ROLN_DOUBLE
#define PICK(f, d) (d)
#else
#define PICK(f, d) (f)
#endif

/* ---- known motions ---- */

enum { COUNT = 4096 };
enum motion_kind { COUPLED, DOUBLE_PENDULUM };
enum { DAMPED = 1, FORCED = 2 };

/* COUPLED: n pendulums with springs to the next, M = I, any n. DOUBLE_PENDULUM: rods without mass, n = 2, length, masses and
   gravity 1. DAMPED: zd over 5 against every motion. */
static void known(enum motion_kind kind, int flags, int n, const roln_real *s, const roln_real *tau, roln_real *zdd)
{
    const roln_real *zd = s + n;
    double f[N_MAX];
    int i;
    for (i = 0; i < n; i++) {
        const double weight = kind == DOUBLE_PENDULUM && i == 0 ? 2 : 1;
        f[i] = -weight * sin((double)s[i]) - (flags & DAMPED ? 0.2 * (double)zd[i] : 0) + (tau ? (double)tau[i] : 0);
    }
    for (i = 0; i + 1 < n && kind == COUPLED; i++) {
        const double pull = 0.5 * (double)(s[i + 1] - s[i]);
        f[i] += pull, f[i + 1] -= pull;
    }
    if (kind == DOUBLE_PENDULUM) {
        const double d = (double)(s[0] - s[1]), c = cos(d), det = 2 - c * c;
        const double a = f[0] - sin(d) * (double)zd[1] * (double)zd[1], b = f[1] + sin(d) * (double)zd[0] * (double)zd[0];
        f[0] = (a - c * b) / det;
        f[1] = (2 * b - c * a) / det;
    }
    for (i = 0; i < n; i++)
        zdd[i] = (roln_real)f[i];
}

static roln_real z[COUNT * N_MAX], zd[COUNT * N_MAX], zdd[COUNT * N_MAX], tau_z[COUNT * N_MAX];

static void uniform(int count, roln_real size, uint64_t *seed, roln_real *x)
{
    while (count-- > 0)
        *x++ = size * (2 * roln_uniform(seed) - 1);
}

/* COUNT samples of z, zd, zdd, tau_z, in a box. */
static void sample(enum motion_kind kind, int flags, int n, uint64_t seed)
{
    int i;
    uniform(COUNT * n, ROLN_C(1.5), &seed, z);
    uniform(COUNT * n, ROLN_C(1.5), &seed, zd);
    uniform(COUNT * n, 1, &seed, tau_z);
    for (i = 0; i < COUNT; i++) {
        roln_real s[2 * N_MAX];
        memcpy(s, z + i * n, (size_t)n * sizeof *s);
        memcpy(s + n, zd + i * n, (size_t)n * sizeof *s);
        known(kind, flags, n, s, flags & FORCED ? tau_z + i * n : NULL, zdd + i * n);
    }
}

/* Error of the rate on fresh states inside the sampled box, over the size of what is predicted. */
static double rate_error(const struct latent *m, enum motion_kind kind, int flags)
{
    const int n = m->n;
    roln_real s[2 * N_MAX], tau[N_MAX], sd[2 * N_MAX], truth[2 * N_MAX];
    uint64_t seed = 77;
    double error = 0, size = 0;
    int i, k;
    for (k = 0; k < 500; k++) {
        uniform(2 * n, ROLN_C(1.3), &seed, s);
        uniform(n, ROLN_C(0.8), &seed, tau);
        memcpy(truth, s + n, (size_t)n * sizeof *s);
        known(kind, flags, n, s, flags & FORCED ? tau : NULL, truth + n);
        if (latent_rate(m, s, flags & FORCED ? tau : NULL, sd) != ROLN_OK) return 1e9;
        for (i = 0; i < 2 * n; i++) {
            error += (double)(sd[i] - truth[i]) * (double)(sd[i] - truth[i]);
            size += (double)truth[i] * (double)truth[i];
        }
    }
    return sqrt(error / size);
}

/* ---- derivatives ---- */

/* A model with random weights and biases; W of SYMODEN, whose inverse enters, well away from singular. */
static struct latent *random_model(enum latent_kind kind, int flags, int n, uint64_t *seed)
{
    struct latent *m = latent_new(kind, n, flags & FORCED, 1, *seed);
    int i;
    if (!CHECK(m != NULL)) exit(1);
    for (i = 0; i < latent_params(m); i++)
        m->theta[i] += ROLN_C(0.15) * roln_normal(seed);
    for (i = 0; kind == LATENT_SYMODEN && i < n; i++)
        m->theta[m->at[1] - ROLN_TRI(n) + i] += 4;
    return m;
}

#ifdef ROLN_DOUBLE
/* <bar, s'>, or COMET's other terms. */
static double number_of(const struct latent *m, const roln_real *s, const roln_real *tau, const roln_real *bar)
{
    roln_real sd[2 * N_MAX];
    uint64_t signs = 9;
    if (!bar) return latent_extra(m, s, tau, s, &signs, NULL);
    CHECK(latent_rate(m, s, tau, sd) == ROLN_OK);
    return roln_dot(2 * m->n, bar, sd);
}

/* Of that number: the largest error of its derivative by the count numbers x, over the largest derivative. */
static double off(const struct latent *m, const roln_real *s, const roln_real *tau, const roln_real *bar, int count, roln_real *x,
                  const roln_real *g)
{
    const double h = 1e-5;
    double worst = 0, top = 0;
    int i;
    for (i = 0; i < count; i++) {
        const double keep = x[i];
        double up, down;
        x[i] = keep + h, up = number_of(m, s, tau, bar);
        x[i] = keep - h, down = number_of(m, s, tau, bar);
        x[i] = keep;
        if (!(fabs((up - down) / (2 * h) - g[i]) <= worst)) worst = fabs((up - down) / (2 * h) - g[i]);
        if (fabs(g[i]) > top) top = fabs(g[i]);
    }
    return worst / top;
}

static void test_derivatives(enum latent_kind kind, int flags, int n)
{
    static roln_real g[40000];
    roln_real s[2 * N_MAX], bar[2 * N_MAX], tau[N_MAX], gs[2 * N_MAX];
    const roln_real *force = flags & FORCED ? tau : NULL;
    uint64_t seed = 11 + (uint64_t)n, signs = 9;
    struct latent *m = random_model(kind, flags, n, &seed);
    int k, i;
    uniform(2 * n, 1, &seed, s);
    uniform(2 * n, 1, &seed, bar);
    uniform(n, 1, &seed, tau);
    CHECK(latent_params(m) <= 40000);
    memset(g, 0, sizeof g);
    CHECK(latent_bwd(m, s, force, bar, gs, g) == ROLN_OK);
    for (k = 0; k < m->nets; k++) {
        double largest = 0;
        for (i = m->at[k]; i < m->at[k + 1]; i++)
            largest = fabs(g[i]) > largest ? fabs(g[i]) : largest;
        CHECK_BELOW(1e-3, largest); /* every network is reached */
    }
    CHECK_BELOW(off(m, s, force, bar, latent_params(m), m->theta, g), 3e-9);
    CHECK_BELOW(off(m, s, force, bar, 2 * n, s, gs), 3e-9);
    memset(g, 0, sizeof g);
    latent_extra(m, s, force, s, &signs, g);
    if (kind == LATENT_COMET) CHECK_BELOW(off(m, s, force, NULL, latent_params(m), m->theta, g), 3e-9);
    else CHECK(number_of(m, s, force, NULL) == 0 && g[0] == 0);
    latent_free(m);
}
#endif

/* ---- promises ---- */

/* y of network k at x. */
static void output(const struct latent *m, int k, const roln_real *x, roln_real *y)
{
    roln_real slope[2 * HIDDEN], out[2 * HIDDEN];
    roln_mlp_forward(&m->net[k], 1, 1, 1, m->theta + m->at[k], x, y, slope, out);
}

/* L and D of a triangle network at z. */
static void triangle(const struct latent *m, int k, const roln_real *x, roln_real *L)
{
    roln_real y[ROLN_TRI(N_MAX)];
    output(m, k, x, y);
    rolni_low(m->n, y, L);
}

/* W(z) and its Cholesky factor C. */
static roln_status inverse_mass(const struct latent *m, const roln_real *x, roln_real *W, roln_real *C)
{
    roln_real L[N_MAX * N_MAX];
    int i;
    triangle(m, 0, x, L);
    roln_mm_bt(m->n, m->n, m->n, L, L, W);
    for (i = 0; i < m->n; i++)
        W[i * m->n + i] += LEAST;
    return roln_chol(m->n, W, C);
}

/* p = W(z)^-1 zd. */
static void momentum(const struct latent *m, const roln_real *s, roln_real *p)
{
    roln_real W[N_MAX * N_MAX], C[N_MAX * N_MAX];
    CHECK(inverse_mass(m, s, W, C) == ROLN_OK);
    roln_solve_lower(m->n, C, s + m->n, p);
    roln_solve_lower_t(m->n, C, p, p);
}

/* (f(s + h d) - f(s - h d)) / 2h of the model's energy; p given: at this momentum, zd = W(z) p. */
static double energy_slope(const struct latent *m, const roln_real *s, const roln_real *d, const roln_real *p)
{
    const int n = m->n;
    const roln_real h = PICK(ROLN_C(3e-3), 1e-5);
    roln_real x[2 * N_MAX], W[N_MAX * N_MAX], C[N_MAX * N_MAX];
    double E[2] = {0, 0};
    int side, i;
    for (side = 0; side < 2; side++) {
        for (i = 0; i < 2 * n; i++)
            x[i] = s[i] + (side ? h : -h) * d[i];
        if (p) {
            CHECK(inverse_mass(m, x, W, C) == ROLN_OK);
            roln_mm(1, n, n, p, W, x + n);
        }
        CHECK(latent_energy(m, x, E + side) == 1);
    }
    return (E[1] - E[0]) / (2 * (double)h);
}

/* HNN, DHNN: zd' and z' against differences of H, what DHNN adds against differences of D. */
static void test_canonical(enum latent_kind kind)
{
    enum { n = 3 };
    uint64_t seed = 21;
    struct latent *m = random_model(kind, FORCED, n, &seed);
    int k, i, j;
    for (k = 0; k < 5; k++) {
        roln_real s[2 * n], tau[n], sd[2 * n], none[2 * n];
        uniform(2 * n, 1, &seed, s);
        uniform(n, 1, &seed, tau);
        CHECK(latent_rate(m, s, tau, sd) == ROLN_OK && latent_rate(m, s, NULL, none) == ROLN_OK);
        for (i = 0; i < n; i++) {
            CHECK(sd[i] == none[i]);
            CHECK_NEAR(sd[n + i] - none[n + i], tau[i], PICK(1e-5, 1e-14));
        }
        for (i = 0; i < 2 * n; i++) {
            const roln_real h = PICK(ROLN_C(3e-3), 1e-5);
            roln_real e[2 * n] = {0}, x[2 * n], y;
            double d = 0, rate;
            e[i < n ? n + i : i - n] = 1;
            rate = (i < n ? 1 : -1) * energy_slope(m, s, e, NULL);
            for (j = 0; kind == LATENT_DHNN && j < 2; j++) {
                memcpy(x, s, sizeof x);
                x[i] += j ? h : -h;
                output(m, 1, x, &y);
                d += (j ? 1 : -1) * (double)y / (2 * (double)h);
            }
            CHECK_NEAR(none[i], rate + d, PICK(2e-3, 1e-8));
        }
    }
    latent_free(m);
}

/* SYMODEN: p' = -dH/dz - D zd + tau along the rate, dH/dt = zd . tau - zd^T D zd; W positive definite. */
static void test_symoden(int n)
{
    const roln_real h = PICK(ROLN_C(1e-3), 1e-5);
    uint64_t seed = 31;
    struct latent *m = random_model(LATENT_SYMODEN, FORCED, n, &seed);
    int k, i;
    for (k = 0; k < 5; k++) {
        roln_real s[2 * N_MAX], tau[N_MAX], sd[2 * N_MAX], W[N_MAX * N_MAX], C[N_MAX * N_MAX], R[N_MAX * N_MAX];
        roln_real p[N_MAX], up[N_MAX], down[N_MAX], x[2 * N_MAX], a[N_MAX], drag[N_MAX];
        double power = 0, size = 1;
        uniform(2 * n, 1, &seed, s);
        uniform(n, 1, &seed, tau);
        CHECK(latent_rate(m, s, tau, sd) == ROLN_OK);
        CHECK(memcmp(sd, s + n, (size_t)n * sizeof *s) == 0);
        CHECK(inverse_mass(m, s, W, C) == ROLN_OK);
        triangle(m, 2, s, R);
        roln_mm(1, n, n, s + n, R, a);
        roln_mm_bt(1, n, n, a, R, drag);
        momentum(m, s, p);
        for (i = 0; i < 2 * n; i++)
            x[i] = s[i] + h * sd[i];
        momentum(m, x, up);
        for (i = 0; i < 2 * n; i++)
            x[i] = s[i] - h * sd[i];
        momentum(m, x, down);
        for (i = 0; i < n; i++)
            size = fabs((double)p[i]) > size ? fabs((double)p[i]) : size;
        for (i = 0; i < n; i++) {
            roln_real e[2 * N_MAX] = {0};
            e[i] = 1;
            power += (double)s[n + i] * (double)(tau[i] - drag[i]);
            CHECK_NEAR((up[i] - down[i]) / (2 * h), (double)(tau[i] - drag[i]) - energy_slope(m, s, e, p),
                       size * size * PICK(2e-2, 1e-7));
        }
        CHECK_NEAR(energy_slope(m, s, sd, NULL), power, size * size * PICK(2e-2, 1e-7));
    }
    latent_free(m);
}

/* SYMODEN begins with W near I and D near 0. */
static void test_start(void)
{
    roln_real W[9], C[9], R[9];
    struct latent *m = latent_new(LATENT_SYMODEN, 3, 0, 1, 51), *steep = latent_new(LATENT_SYMODEN, 3, 0, 4, 51);
    int i;
    sample(COUPLED, 0, 3, 3);
    CHECK(inverse_mass(m, z, W, C) == ROLN_OK);
    triangle(m, 2, z, R);
    for (i = 0; i < 9; i++) {
        CHECK_NEAR(W[i], i % 4 == 0, 0.5);
        CHECK_NEAR(R[i], 0, 0.5);
    }
    for (i = 0; i < latent_params(m); i++)
        CHECK(steep->theta[i] == m->theta[i] * (i < 3 * HIDDEN || (i >= m->at[1] && i < m->at[1] + 3 * HIDDEN) ||
                                                        (i >= m->at[2] && i < m->at[2] + 3 * HIDDEN)
                                                    ? 4
                                                    : 1));
    latent_free(m), latent_free(steep);
}

/* COMET: no rate along grad c, to rounding; the projection takes nothing else. */
static void test_comet(int flags)
{
    enum { n = 3 };
    uint64_t seed = 41;
    struct latent *m = random_model(LATENT_COMET, flags, n, &seed);
    const int in = m->net[0].size[0];
    int k, i;
    CHECK(in == (flags & FORCED ? 3 * n : 2 * n));
    for (k = 0; k < 5; k++) {
        roln_real x[3 * n] = {0}, sd[2 * n], y[2 * n + 1], gy[2 * n + 1] = {0}, g[3 * n] = {0}, e[2 * n];
        roln_real slope[2 * HIDDEN], out[2 * HIDDEN], work[ROLN_MLP_BWD_WORK(1, 1, 2 * HIDDEN)], a;
        uniform(in, 1, &seed, x);
        CHECK(latent_rate(m, x, flags & FORCED ? x + 2 * n : NULL, sd) == ROLN_OK);
        roln_mlp_forward(m->net, 1, 1, 1, m->theta, x, y, slope, out);
        gy[2 * n] = 1;
        roln_mlp_bwd(m->net, 1, 1, m->theta, NULL, slope, gy, g, NULL, work);
        a = ROLN_SQRT(roln_dot(2 * n, g, g));
        CHECK_BELOW(ROLN_ABS(roln_dot(2 * n, g, sd)), 8 * ROLN_EPS * a * ROLN_SQRT(roln_dot(2 * n, y, y)));
        for (i = 0; i < 2 * n; i++)
            e[i] = y[i] - sd[i];
        CHECK_NEAR(ROLN_ABS(roln_dot(2 * n, g, e)), a * ROLN_SQRT(roln_dot(2 * n, e, e)), 100 * ROLN_EPS * a);
    }
    latent_free(m);
}

/* One step of Runge-Kutta, no force. */
static void rk4(const struct latent *m, roln_real h, roln_real *s)
{
    const int n2 = 2 * m->n;
    roln_real k[4][2 * N_MAX], x[2 * N_MAX];
    int j, i;
    for (j = 0; j < 4; j++) {
        for (i = 0; i < n2; i++)
            x[i] = s[i] + (j == 0 ? 0 : (j == 3 ? h : h / 2) * k[j - 1][i]);
        CHECK(latent_rate(m, x, NULL, k[j]) == ROLN_OK);
    }
    for (i = 0; i < n2; i++)
        s[i] += h / 6 * (k[0][i] + 2 * k[1][i] + 2 * k[2][i] + k[3][i]);
}

/* ---- learning ---- */

enum { ROWS = 400 };
struct pupil {
    struct latent *m;
    int flags, at[ROWS];
    uint64_t signs;
};

static void pupil_draw(void *self, int count, double share, uint64_t *seed)
{
    struct pupil *p = self;
    int k;
    (void)share;
    p->signs = roln_rand(seed);
    for (k = 0; k < count; k++)
        p->at[k] = roln_randint(COUNT, seed);
}

/* Of +-1 for each number of s', and of COMET's other terms. */
static void pupil_rows(void *self, const roln_real *x, int from, int count, roln_real *J, roln_real *r)
{
    struct pupil *p = self;
    const int n = p->m->n, P = latent_params(p->m);
    int k, i;
    memmove(p->m->theta, x, (size_t)P * sizeof *x);
    for (k = 0; k < count; k++) {
        const int at = p->at[from + k];
        const roln_real *tau = p->flags & FORCED ? tau_z + at * n : NULL;
        uint64_t signs = p->signs + (uint64_t)(from + k);
        roln_real s[2 * N_MAX], sd[2 * N_MAX], bar[2 * N_MAX], rate[2 * N_MAX], gs[2 * N_MAX], *row = J ? J + k * P : NULL;
        for (i = 0; i < n; i++)
            s[i] = z[at * n + i], s[n + i] = sd[i] = zd[at * n + i], sd[n + i] = zdd[at * n + i];
        for (i = 0; i < 2 * n; i++)
            bar[i] = roln_rand(&signs) >> 63 ? ROLN_C(1.0) : ROLN_C(-1.0);
        CHECK(latent_rate(p->m, s, tau, rate) == ROLN_OK);
        if (row) memset(row, 0, (size_t)P * sizeof *row);
        if (row) CHECK(latent_bwd(p->m, s, tau, bar, gs, row) == ROLN_OK);
        for (r[k] = 0, i = 0; i < 2 * n; i++)
            r[k] += bar[i] * (sd[i] - rate[i]);
        r[k] -= latent_extra(p->m, s, tau, sd, &signs, row);
    }
}

/* Trains and returns the model; its rate is right to `bound`. */
static struct latent *learn(enum latent_kind kind, enum motion_kind motion, int flags, int n, int steps, double bound)
{
    struct latent *m = latent_new(kind, n, flags & FORCED, 1, 1);
    const roln_block block = {ROLN_EUCLIDEAN, latent_params(m), 1, 0};
    struct newton *trainer = newton_new(1, &block, ROWS);
    struct pupil pupil = {m, flags, {0}, 0};
    const struct newton_task task = {&pupil, pupil_draw, pupil_rows, NULL};
    const struct stage stage = {.kind = STAGE_NEWTON, .most = steps, .batch = ROWS};
    roln_real *x = calloc((size_t)block.rows, sizeof *x);
    sample(motion, flags, n, 5);
    if (!CHECK(x != NULL)) exit(1);
    memcpy(x, m->theta, (size_t)block.rows * sizeof *x);
    CHECK(newton_run(trainer, &task, &stage, x, 1e9, 1) == steps);
    newton_mean(trainer, x);
    memcpy(m->theta, x, (size_t)block.rows * sizeof *x);
    CHECK_BELOW(rate_error(m, motion, flags), bound);
    newton_free(trainer), free(x);
    return m;
}

static void test_learning(void)
{
    const roln_real start[4] = {1, ROLN_C(-0.5), ROLN_C(0.2), ROLN_C(0.7)}, h = ROLN_C(0.02);
    roln_real s[4];
    struct latent *m;
    double E0 = 0, E = 0, before, drift = 0;
    int i;

    m = learn(LATENT_MLP, DOUBLE_PENDULUM, DAMPED | FORCED, 2, 60, 0.04);
    CHECK(latent_energy(m, start, &E) == 0);
    latent_free(m);

    m = learn(LATENT_HNN, COUPLED, FORCED, 2, 60, 0.01);
    memcpy(s, start, sizeof s);
    CHECK(latent_energy(m, s, &E0) == 1);
    for (i = 0; i < 500; i++) {
        rk4(m, h, s);
        CHECK(latent_energy(m, s, &E) == 1);
        drift = fabs(E - E0) > drift ? fabs(E - E0) : drift;
    }
    CHECK_BELOW(drift, PICK(2e-5, 1e-7));
    CHECK_BELOW(0.3, fabs((double)(s[0] - start[0]))); /* it did move */
    latent_free(m);

    m = learn(LATENT_DHNN, COUPLED, DAMPED | FORCED, 2, 60, 0.01);
    latent_free(m);

    m = learn(LATENT_SYMODEN, DOUBLE_PENDULUM, DAMPED | FORCED, 2, 150, 0.015);
    memcpy(s, start, sizeof s);
    CHECK(latent_energy(m, s, &E0) == 1);
    for (before = E0, i = 0; i < 500; i++) {
        roln_real W[4], C[4];
        CHECK(inverse_mass(m, s, W, C) == ROLN_OK);
        rk4(m, h, s);
        CHECK(latent_energy(m, s, &E) == 1);
        CHECK_BELOW(E, before + PICK(2e-6, 1e-9));
        before = E;
    }
    CHECK_BELOW(E, E0 - 0.2);
    latent_free(m);

    m = learn(LATENT_COMET, COUPLED, 0, 2, 60, 0.02);
    CHECK(latent_energy(m, start, &E) == 0);
    latent_free(m);
}

static void test_refusals(void)
{
    uint64_t seed = 1;
    int kind, flags;
    for (kind = 0; kind < LATENT_KINDS; kind++) /* with n = 16; work memory on the stack suffices */
        for (flags = 0; flags <= FORCED; flags += FORCED) {
            const roln_real s[2 * N_MAX] = {(roln_real)NAN};
            roln_real sd[2 * N_MAX] = {7};
            struct latent *m = random_model((enum latent_kind)kind, flags, N_MAX, &seed);
            CHECK_BELOW(pass_of(m, NULL).size, ROW);
            CHECK(latent_rate(m, s, NULL, sd) != ROLN_OK && sd[0] == 7);
            latent_free(m);
        }
    CHECK(latent_new(LATENT_HNN, N_MAX + 1, 0, 1, 1) == NULL && latent_new(LATENT_HNN, 0, 0, 1, 1) == NULL);
    CHECK(latent_new(LATENT_KINDS, 2, 0, 1, 1) == NULL);
}

void TEST_NAME(latent)(void)
{
#ifdef ROLN_DOUBLE
    int kind;
    for (kind = 0; kind < LATENT_KINDS; kind++) {
        test_derivatives((enum latent_kind)kind, 0, 2);
        test_derivatives((enum latent_kind)kind, FORCED, 3);
    }
#endif
    test_canonical(LATENT_HNN);
    test_canonical(LATENT_DHNN);
    test_symoden(1);
    test_symoden(3);
    test_start();
    test_comet(0);
    test_comet(FORCED);
    test_learning();
    test_refusals();
}

#ifndef ROLN_DOUBLE
int main(void)
{
    test_latent_f32();
    test_latent_f64();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
#endif
