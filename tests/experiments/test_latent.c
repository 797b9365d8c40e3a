/* test_latent.c - the latent models of latent.c: gradients against central differences, the equations they promise against
   differences of their own H and c, and that they learn motions known in closed form. Both precisions in one program, so the
   public names of latent.c carry the precision. */
#include "../unit/check.h"

#define latent_train TEST_NAME(latent_train)
#define latent_free TEST_NAME(latent_free)
#define latent_params TEST_NAME(latent_params)
#define latent_rate TEST_NAME(latent_rate)
#define latent_energy TEST_NAME(latent_energy)
#include "latent.c"

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

static struct latent_data sample(enum motion_kind kind, int flags, int n, uint64_t seed)
{
    const struct latent_data d = {COUNT, n, z, zd, zdd, flags & FORCED ? tau_z : NULL};
    int i;
    uniform(COUNT * n, ROLN_C(1.5), &seed, z);
    uniform(COUNT * n, ROLN_C(1.5), &seed, zd);
    uniform(COUNT * n, 1, &seed, tau_z);
    for (i = 0; i < COUNT; i++) {
        roln_real s[2 * N_MAX];
        memcpy(s, z + i * n, (size_t)n * sizeof *s);
        memcpy(s + n, zd + i * n, (size_t)n * sizeof *s);
        known(kind, flags, n, s, d.tau_z ? tau_z + i * n : NULL, zdd + i * n);
    }
    return d;
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

/* ---- gradients ---- */

/* A model with random weights and biases; W of SYMODEN, whose inverse enters, well away from singular. */
static struct latent *random_model(enum latent_kind kind, int flags, int n, uint64_t *seed)
{
    const struct latent_data d = sample(COUPLED, flags, n, 3);
    struct latent *m;
    int i;
    CHECK(latent_train(&m, kind, &d, 0, 1, 0, *seed) == 0);
    for (i = 0; i < latent_params(m); i++)
        m->theta[i] += ROLN_C(0.15) * roln_normal(seed);
    for (i = 0; kind == LATENT_SYMODEN && i < n; i++)
        m->theta[m->at[1] - ROLN_TRI(n) + i] += 4;
    return m;
}

#ifdef ROLN_DOUBLE
enum { ROWS = 3 };

static double loss_of(const struct latent *m, const roln_real *s, const roln_real *sd, const roln_real *tau, roln_real *g)
{
    static roln_real mem[2 * ROWS * ROW], scratch[40000], s2[4 * ROWS * N_MAX], tau2[2 * ROWS * N_MAX];
    const pass p = pass_of(m, 2 * ROWS, mem);
    uint64_t seed = 9;
    double loss = 0;
    memcpy(s2, s, (size_t)(2 * ROWS * m->n) * sizeof *s);
    if (tau) memcpy(tau2, tau, (size_t)(ROWS * m->n) * sizeof *s);
    return gradient(m, ROWS, s2, sd, tau ? tau2 : NULL, &seed, g ? g : scratch, &loss, &p) == ROLN_OK ? loss : (double)NAN;
}

static void test_gradient(enum latent_kind kind, int flags, int n)
{
    static roln_real g[40000];
    const double h = 1e-5;
    roln_real s[2 * ROWS * N_MAX], sd[2 * ROWS * N_MAX], tau[ROWS * N_MAX];
    uint64_t seed = 11 + (uint64_t)n;
    struct latent *m = random_model(kind, flags, n, &seed);
    double worst = 0, top = 0, largest[NETS] = {0};
    int i, k;
    uniform(2 * ROWS * n, 1, &seed, s);
    uniform(2 * ROWS * n, 1, &seed, sd);
    uniform(ROWS * n, 1, &seed, tau);
    memset(g, 0, sizeof g);
    CHECK(latent_params(m) <= 40000);
    loss_of(m, s, sd, flags & FORCED ? tau : NULL, g);
    for (k = 0; k < m->nets; k++)
        for (i = m->at[k]; i < m->at[k + 1]; i++) {
            const double keep = m->theta[i];
            double up, down, e;
            m->theta[i] = keep + h;
            up = loss_of(m, s, sd, flags & FORCED ? tau : NULL, NULL);
            m->theta[i] = keep - h;
            down = loss_of(m, s, sd, flags & FORCED ? tau : NULL, NULL);
            m->theta[i] = keep;
            e = fabs((up - down) / (2 * h) - g[i]);
            if (!(e <= worst)) worst = e;
            largest[k] = fabs(g[i]) > largest[k] ? fabs(g[i]) : largest[k];
            top = largest[k] > top ? largest[k] : top;
        }
    CHECK_BELOW(worst / top, 3e-9);
    for (k = 0; k < m->nets; k++) /* every network is reached by the loss */
        CHECK_BELOW(1e-3 * top, largest[k]);
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
    const struct latent_data d = sample(COUPLED, 0, 3, 3);
    roln_real W[9], C[9], R[9];
    struct latent *m;
    int i;
    CHECK(latent_train(&m, LATENT_SYMODEN, &d, 0, 1, 0, 51) == 0);
    CHECK(inverse_mass(m, z, W, C) == ROLN_OK);
    triangle(m, 2, z, R);
    for (i = 0; i < 9; i++) {
        CHECK_NEAR(W[i], i % 4 == 0, 0.5);
        CHECK_NEAR(R[i], 0, 0.5);
    }
    latent_free(m);
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

/* Trains and returns the model; its rate is right to `bound`. */
static struct latent *learn(enum latent_kind kind, enum motion_kind motion, int flags, int n, int updates, double bound)
{
    const struct latent_data d = sample(motion, flags, n, 5);
    struct latent *m;
    CHECK(latent_train(&m, kind, &d, updates, 64, 5e-3, 1) == 0);
    CHECK_BELOW(rate_error(m, motion, flags), bound);
    return m;
}

static void test_learning(void)
{
    const roln_real start[4] = {1, ROLN_C(-0.5), ROLN_C(0.2), ROLN_C(0.7)}, h = ROLN_C(0.02);
    roln_real s[4];
    struct latent *m;
    double E0 = 0, E = 0, before, drift = 0;
    int i;

    m = learn(LATENT_MLP, DOUBLE_PENDULUM, DAMPED | FORCED, 2, 3000, 0.12);
    CHECK(latent_energy(m, start, &E) == 0);
    latent_free(m);

    m = learn(LATENT_HNN, COUPLED, FORCED, 2, 3000, 0.03);
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

    m = learn(LATENT_DHNN, COUPLED, DAMPED | FORCED, 2, 3000, 0.03);
    latent_free(m);

    m = learn(LATENT_SYMODEN, DOUBLE_PENDULUM, DAMPED | FORCED, 2, 3000, 0.03);
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

    m = learn(LATENT_COMET, COUPLED, 0, 2, 3000, 0.09);
    CHECK(latent_energy(m, start, &E) == 0);
    latent_free(m);
}

static void test_refusals(void)
{
    struct latent_data d = sample(COUPLED, 0, 2, 5);
    struct latent *m = NULL;
    uint64_t seed = 1;
    int kind, flags;
    for (kind = 0; kind < LATENT_KINDS; kind++) /* with n = 16; work memory on the stack suffices */
        for (flags = 0; flags <= FORCED; flags += FORCED) {
            const roln_real s[2 * N_MAX] = {(roln_real)NAN};
            roln_real sd[2 * N_MAX] = {7};
            m = random_model((enum latent_kind)kind, flags, N_MAX, &seed);
            CHECK_BELOW(pass_of(m, 1, NULL).size, ROW);
            CHECK(latent_rate(m, s, NULL, sd) != ROLN_OK && sd[0] == 7);
            latent_free(m);
        }
    fprintf(stderr, "four refusals are to follow:\n");
    d.n = N_MAX + 1;
    CHECK(latent_train(&m, LATENT_HNN, &d, 1, 1, 1e-3, 1) == -1 && m == NULL);
    d.n = 2;
    CHECK(latent_train(&m, LATENT_KINDS, &d, 1, 1, 1e-3, 1) == -1 && m == NULL);
    CHECK(latent_train(&m, LATENT_HNN, &d, 1, COUNT + 1, 1e-3, 1) == -1 && m == NULL);
    zdd[0] = (roln_real)NAN;
    d.count = 16;
    CHECK(latent_train(&m, LATENT_HNN, &d, 2000, 16, 1e-3, 1) == -1 && m == NULL);
}

void TEST_NAME(latent)(void)
{
#ifdef ROLN_DOUBLE
    int kind;
    for (kind = 0; kind < LATENT_KINDS; kind++) {
        test_gradient((enum latent_kind)kind, 0, 2);
        test_gradient((enum latent_kind)kind, FORCED, 3);
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
