/* ekf.c - an extended Kalman filter on the learned model: q and qd of the chain from noisy joint angles alone.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/ekf.c -o ekf -lm

   The plant is the true chain of chain_plant.h: the model has seen other recordings of it, the filter none. 20 runs of 5 s.
   No force acts; under a known one give chain_linear its torque, in the model's own unit (see control_tick.c). */

#include <stdio.h>
#include "chain.h"
#include "chain_plant.h"
#include "chain_weights.h"

enum { N = chain_N, n = chain_n, n2 = 2 * n };
#define TICK ROLN_C(0.005) /* s */
#define NOISE ROLN_C(0.02) /* rad, of each encoder, Gaussian */

/* ---- 1 the filter: what runs in the controller ------------------------------------------------ */

typedef struct {
    chain_latent s;       /* estimate of (z, zd) */
    roln_real P[n2 * n2]; /* its covariance */
    roln_real push;       /* error of the model: white noise on zdd, 1/s^1.5 */
    roln_real nis;        /* normalised innovation squared of the last tick: chi-square, a degree per working encoder */
    roln_real log_det;    /* of the covariance of that innovation */
    chain_jacobian step;  /* derivatives of the last one */
    chain_linwork linwork;
    chain_work work;
} filter;

/* At the pose that the encoders show, at rest; P as wide as what the training has seen. Every encoder must work. */
static roln_status filter_start(filter *f, const roln_real y[N], roln_real push)
{
    chain_state x = {{0}, {0}};
    memcpy(x.q, y, sizeof x.q);
    memset(f->P, 0, sizeof f->P);
    f->push = push;
    for (int i = 0; i < n; i++) {
        const roln_real width = chain_weights.z_max[i] - chain_weights.z_min[i];
        f->P[i * (n2 + 1)] = width * width;
        f->P[(n + i) * (n2 + 1)] = chain_weights.zd_max[i] * chain_weights.zd_max[i];
    }
    return chain_encode(&chain_weights, &x, &f->s, &f->work);
}

/* P = A P A^T + Q, Q that of the white noise integrated once into zd and twice into z. Outside the range seen in training the
   model guesses: ten times the noise, a guess too. */
static roln_status predict(filter *f)
{
    const roln_real push = chain_in_range(&chain_weights, &f->s) ? f->push : 10 * f->push, v = push * push * TICK;
    roln_real AP[n2 * n2];
    const roln_status st = chain_linear(&chain_weights, &f->s, NULL, TICK, &f->step, &f->linwork);
    if (st != ROLN_OK) return st;
    roln_mm(n2, n2, n2, f->step.A, f->P, AP);
    roln_mm_bt(n2, n2, n2, AP, f->step.A, f->P);
    for (int i = 0, j = n; i < n; i++, j++) {
        f->P[i * n2 + i] += v * TICK * TICK / 3;
        f->P[i * n2 + j] += v * TICK / 2;
        f->P[j * n2 + i] += v * TICK / 2;
        f->P[j * n2 + j] += v;
    }
    return ROLN_OK;
}

/* Measurement y = phi(z) + noise, H = [J 0]. All N angles and not z = rho(y), whose D is not the least-squares inverse of J:
   the error of q is then a fifth larger; the noise is white here, and an encoder that is broken (NaN) a row of zeros. */
static roln_status correct(filter *f, const roln_real y[N])
{
    const roln_real R = NOISE * NOISE;
    roln_real H[N * n2] = {0}, PH[n2 * N], L[N * N], K[n2 * N], F[n2 * n2], FP[n2 * n2], KK[n2 * n2], e[N], d[n2];
    chain_state x;
    for (int j = 0; j < n; j++) { /* columns of J: qd of unit zd */
        chain_latent unit = {{0}, {0}};
        roln_status st;
        memcpy(unit.z, f->s.z, sizeof unit.z);
        unit.zd[j] = 1;
        st = chain_decode(&chain_weights, &unit, &x, &f->work);
        if (st != ROLN_OK) return st;
        for (int i = 0; i < N; i++)
            H[i * n2 + j] = roln_finite(y[i]) ? x.qd[i] : 0;
    }
    for (int i = 0; i < N; i++)
        e[i] = roln_finite(y[i]) ? y[i] - x.q[i] : 0;
    roln_mm_bt(n2, n2, N, f->P, H, PH); /* S = H P H^T + R I = L L^T, K = P H^T S^-1 */
    roln_mm(N, n2, N, H, PH, L);
    for (int i = 0; i < N; i++)
        L[i * (N + 1)] += R;
    if (roln_chol(N, L, L) != ROLN_OK) return ROLN_E_NOT_SPD;
    for (int i = 0; i < n2; i++) {
        roln_solve_lower(N, L, PH + i * N, K + i * N);
        roln_solve_lower_t(N, L, K + i * N, K + i * N);
    }
    roln_mm_bt(1, N, n2, e, K, d); /* (z, zd) += K e */
    if (!roln_all_finite(n2, d)) return ROLN_E_NOT_FINITE;
    for (int i = 0; i < n; i++) {
        f->s.z[i] += d[i];
        f->s.zd[i] += d[n + i];
    }
    roln_mm(n2, N, n2, K, H, F); /* Joseph: P = F P F^T + R K K^T, F = I - K H */
    for (int i = 0; i < n2 * n2; i++)
        F[i] = (i % (n2 + 1) == 0) - F[i];
    roln_mm(n2, n2, n2, F, f->P, FP);
    roln_mm_bt(n2, n2, n2, FP, F, f->P);
    roln_mm_bt(n2, N, n2, K, K, KK);
    for (int i = 0; i < n2; i++)
        for (int j = 0; j <= i; j++) /* symmetric to the bit */
            f->P[i * n2 + j] = f->P[j * n2 + i] = (f->P[i * n2 + j] + f->P[j * n2 + i]) / 2 + R * KK[i * n2 + j];
    roln_solve_lower(N, L, e, e);
    f->nis = roln_dot(N, e, e);
    f->log_det = 0;
    for (int i = 0; i < N; i++)
        f->log_det += 2 * roln_log(L[i * (N + 1)]);
    return ROLN_OK;
}

/* One tick: angles y in (NaN: none), estimate f->s out. Unless ROLN_OK it is the last or the predicted one: start again. */
static roln_status filter_tick(filter *f, const roln_real y[N])
{
    const roln_status st = predict(f);
    return st == ROLN_OK ? correct(f, y) : st;
}

/* ---- 2 the experiment ------------------------------------------------------------------------- */

enum { RUNS = 20, TUNE = 5, TICKS = 1000, SETTLED = 100, COUNT = TICKS - SETTLED }; /* errors count after 0.5 s */
static chain_state truth[RUNS][TICKS + 1];
static roln_real y[RUNS][TICKS + 1][N];
static filter ekf; /* RAM */

/* Runs of the true chain from anywhere, as in the training, and what the encoders say. */
static void simulate(int runs, uint64_t *seed)
{
    for (int r = 0; r < runs; r++) {
        motion s;
        for (int i = 0; i < 2; i++) {
            s.z[i] = 1.4 * (double)roln_uniform(seed) - 0.7;
            s.zd[i] = 2 * (double)roln_uniform(seed) - 1;
        }
        for (int k = 0; k <= TICKS; k++) {
            const pose p = pose_of(&s);
            for (int i = 0; i < N; i++) {
                truth[r][k].q[i] = (roln_real)(p.a[i] - (i > 0 ? p.a[i - 1] : 0));
                truth[r][k].qd[i] = (roln_real)(p.ad[i] - (i > 0 ? p.ad[i - 1] : 0));
                y[r][k][i] = truth[r][k].q[i] + NOISE * roln_normal(seed);
            }
            for (int i = 0; i < 5; i++)
                advance(&s, (double)TICK / 5);
        }
    }
}

typedef struct { double q, qd; } error; /* sums of squares, at last rms over all joints, settled ticks, runs */

static void compare(const roln_real *q, const roln_real *qd, const chain_state *x, error *e)
{
    for (int i = 0; i < N; i++) {
        const double d = (double)(q[i] - x->q[i]), dd = (double)(qd[i] - x->qd[i]);
        e->q += d * d;
        e->qd += dd * dd;
    }
}

static error rms(error e, int count)
{
    e.q = sqrt(e.q / count / N);
    e.qd = sqrt(e.qd / count / N);
    return e;
}

/* Measured angles and their central differences, which look one tick ahead. */
static error raw(void)
{
    error e = {0, 0};
    for (int r = 0; r < RUNS; r++)
        for (int k = SETTLED; k < TICKS; k++) {
            roln_real qd[N];
            for (int i = 0; i < N; i++)
                qd[i] = (y[r][k + 1][i] - y[r][k - 1][i]) / (2 * TICK);
            compare(y[r][k], qd, &truth[r][k], &e);
        }
    return rms(e, RUNS * COUNT);
}

/* Critically damped alpha-beta (gamma = 0) or alpha-beta-gamma filter of each joint, with poles at p. */
static error tracker(int order, double p)
{
    const double a = order == 2 ? 1 - p * p : 1 - p * p * p, b = (order == 2 ? 1 : 1.5 * (1 + p)) * (1 - p) * (1 - p);
    const roln_real alpha = (roln_real)a, beta = (roln_real)b / TICK, T = TICK;
    const roln_real gamma = order == 2 ? 0 : (roln_real)((1 - p) * (1 - p) * (1 - p)) / (T * T);
    error e = {0, 0};
    for (int r = 0; r < RUNS; r++) {
        roln_real q[N], qd[N] = {0}, qdd[N] = {0};
        memcpy(q, y[r][0], sizeof q);
        for (int k = 1; k < TICKS; k++) {
            for (int i = 0; i < N; i++) {
                const roln_real ahead = q[i] + T * qd[i] + T * T / 2 * qdd[i], d = y[r][k][i] - ahead;
                q[i] = ahead + alpha * d;
                qd[i] += T * qdd[i] + beta * d;
                qdd[i] += gamma * d;
            }
            if (k >= SETTLED) compare(q, qd, &truth[r][k], &e);
        }
    }
    return rms(e, RUNS * COUNT);
}

/* The best that it can do: poles chosen with hindsight, for q and for qd each on its own, among 0.5 .. 0.995. */
static error best_tracker(int order)
{
    error best = {HUGE_VAL, HUGE_VAL};
    for (int i = 0; i < 100; i++) {
        const error e = tracker(order, 0.5 + 0.005 * i);
        best.q = fmin(best.q, e.q);
        best.qd = fmin(best.qd, e.qd);
    }
    return best;
}

/* Sums over runs and settled ticks. */
typedef struct {
    int runs;
    error e, soon;     /* soon: after 0.1 s */
    double nis, nees;  /* normalised innovation and estimation error squared: N (working encoders) and 2n expected */
    double inside;     /* ticks at which the true (z, zd) lies in the ellipsoid of P that should hold 95 % */
    double likelihood; /* log likelihood of the innovations, of all ticks */
} score;

static void add(score *to, const score *s)
{
    to->runs += s->runs;
    to->e.q += s->e.q, to->e.qd += s->e.qd, to->soon.q += s->soon.q, to->soon.qd += s->soon.qd;
    to->nis += s->nis, to->nees += s->nees, to->inside += s->inside, to->likelihood += s->likelihood;
}

/* The filter on run r, with the first `broken` encoders silent after the start. Adds to a if the chain never leaves the range
   seen in training, else to b. */
static roln_status run(int r, int broken, roln_real push, score *a, score *b)
{
    roln_status st = filter_start(&ekf, y[r][0], push);
    score c = {.runs = 1}, *to = a;
    if (st == ROLN_OK) st = correct(&ekf, y[r][0]);
    for (int k = 0; k < TICKS; k++) {
        chain_latent s;
        chain_state x;
        roln_real in[N], d[n2], L[n2 * n2], nees;
        for (int i = 0; i < N; i++)
            in[i] = i < broken ? (roln_real)NAN : y[r][k][i];
        if (k > 0 && st == ROLN_OK) st = filter_tick(&ekf, in);
        if (st == ROLN_OK) st = chain_decode(&chain_weights, &ekf.s, &x, &ekf.work);
        if (st == ROLN_OK) st = chain_encode(&chain_weights, &truth[r][k], &s, &ekf.work); /* the true (z, zd) */
        if (st == ROLN_OK) st = roln_chol(n2, ekf.P, L);
        if (st != ROLN_OK) return st;
        if (!chain_in_range(&chain_weights, &s)) to = b;
        c.likelihood -= 0.5 * (double)(ekf.nis + ekf.log_det);
        if (k == 20) compare(x.q, x.qd, &truth[r][k], &c.soon);
        if (k < SETTLED) continue;
        compare(x.q, x.qd, &truth[r][k], &c.e);
        for (int i = 0; i < n; i++) {
            d[i] = ekf.s.z[i] - s.z[i];
            d[n + i] = ekf.s.zd[i] - s.zd[i];
        }
        roln_solve_lower(n2, L, d, d);
        nees = roln_dot(n2, d, d);
        c.nis += (double)ekf.nis;
        c.nees += (double)nees;
        c.inside += nees < ROLN_C(9.488); /* chi-square, 4 degrees */
    }
    add(to, &c);
    return ROLN_OK;
}

static void print(const char *name, error e, const char *end)
{
    printf("%-40s %8.2f %9.3f%s", name, 1000 * e.q, e.qd, end);
}

static void print_score(const char *name, const score *s)
{
    const double count = s->runs * COUNT;
    if (s->runs == 0) return;
    print(name, rms(s->e, s->runs * COUNT), "");
    printf("%9.3f %7.2f %9.1f %%\n", s->nis / count, s->nees / count, 100 * s->inside / count);
}

int main(void)
{
    static const roln_real pushes[] = {ROLN_C(0.01), ROLN_C(0.02), ROLN_C(0.05), ROLN_C(0.1), ROLN_C(0.2), ROLN_C(0.5), 1};
    static score in, out, total, broken;
    char name[64];
    uint64_t seed = 2026;
    roln_real push = 0;
    double most = -HUGE_VAL;
    printf("flash: weights %u bytes    RAM: filter %u bytes, of them scratch %u\n", (unsigned)sizeof chain_weights,
           (unsigned)sizeof ekf, (unsigned)(sizeof ekf.work + sizeof ekf.linwork));

    /* Q from measurements alone, as on a real machine: the one under which the innovations of other runs are likeliest */
    simulate(TUNE, &seed);
    for (size_t i = 0; i < sizeof pushes / sizeof *pushes; i++) {
        score s = {0};
        for (int r = 0; r < TUNE; r++)
            if (run(r, 0, pushes[i], &s, &s) != ROLN_OK) return 1;
        if (s.likelihood > most) most = s.likelihood, push = 2 * pushes[i]; /* doubled: its error lasts, white noise does not */
    }
    printf("error of the model as white noise on zdd: %g 1/s^1.5, twice the likeliest on %d other runs\n\n", (double)push, TUNE);

    simulate(RUNS, &seed);
    for (int r = 0; r < RUNS; r++)
        if (run(r, 0, push, &in, &out) != ROLN_OK || run(r, 3, push, &broken, &broken) != ROLN_OK) return 1;
    total = in;
    add(&total, &out);
    printf("%2d runs of the true chain, rms errors      q, mrad qd, rad/s      NIS    NEES  within 95 %%\n", RUNS);
    print("measured, central differences", raw(), "\n");
    print("alpha-beta per joint, best poles", best_tracker(2), "\n");
    print("alpha-beta-gamma per joint, best poles", best_tracker(3), "\n");
    print_score("EKF on the learned model", &total);
    snprintf(name, sizeof name, "  %d runs in the range of the training", in.runs);
    print_score(name, &in);
    snprintf(name, sizeof name, "  %d runs that leave it", out.runs);
    print_score(name, &out);
    print_score("EKF, 3 of 8 encoders broken", &broken);
    printf("\nexpected if consistent: NIS 8 +- %.2f (95 %%, all runs; 5 with 3 encoders broken), NEES 4, 95 %% within\n"
           "the filter starts at rest, the chain does not: after 0.1 s qd is off by %.3f rad/s\n",
           1.96 * sqrt(2.0 * N / (RUNS * COUNT)), rms(total.soon, RUNS).qd);
    return 0;
}
