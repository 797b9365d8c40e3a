/* SPDX-License-Identifier: MIT */
/* Lagrangian operator inference on synthetic systems whose operators are known: N = 6, n = 3, q = offset + B z, data with
   random z, zd and forces; and its midpoint rule. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../unit/check.h"
#include "experiment.h"

enum { N = 6, n = 3, ROWS = 400 };

/* zdd = f - C zd - K z + B^T tau + noise; z_k and zd_k have the sizes spread^k and 5 spread^k */
struct truth {
    double B[N * n], offset[N], K[n * n], C[n * n], f[n], noise, spread;
};

static uint64_t seed = 5;

static double normal(void)
{
    return (double)roln_normal(&seed);
}

/* a orthonormal columns of [rows][a] */
static void orthonormal(int rows, int a, double *Q)
{
    for (int i = 0; i < rows * a; i++) Q[i] = normal();
    for (int k = 0; k < a; k++)
        for (int j = 0; j <= k; j++) {
            double s = 0;
            for (int i = 0; i < rows; i++) s += Q[i * a + j] * Q[i * a + k];
            for (int i = 0; i < rows; i++) Q[i * a + k] = j < k ? Q[i * a + k] - s * Q[i * a + j] : Q[i * a + k] / sqrt(s);
        }
}

static void symmetric(const double *l, double *A)
{
    double Q[n * n];
    orthonormal(n, n, Q);
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            A[i * n + j] = 0;
            for (int k = 0; k < n; k++) A[i * n + j] += Q[i * n + k] * l[k] * Q[j * n + k];
        }
}

static struct truth system_of(int affine, const double *K, const double *C, double noise, double spread)
{
    struct truth t;
    memset(&t, 0, sizeof t);
    orthonormal(N, n, t.B);
    symmetric(K, t.K);
    t.noise = noise, t.spread = spread;
    if (affine) {
        symmetric(C, t.C);
        for (int i = 0; i < n; i++) t.f[i] = normal();
        for (int i = 0; i < N; i++) t.offset[i] = normal();
    }
    return t;
}

/* The force held over a step is not the force at the sample. */
static struct motion record(const struct truth *t, int forces)
{
    struct motion m = {TRUTH_PEND2, 4, ROWS / 4, N, 1e-3, NULL, NULL, NULL, NULL, NULL, NULL, 1};
    double mean[N] = {0};
    roln_real *all = calloc(5 * ROWS * N + N, sizeof *all);
    if (!CHECK(all != NULL)) exit(1);
    m.q = all, m.qd = m.q + ROWS * N, m.qdd = m.qd + ROWS * N, m.mean = m.qdd + ROWS * N;
    if (forces) m.tau = m.mean + N, m.tau_mid = m.tau + ROWS * N;
    for (int r = 0; r < ROWS; r++) {
        double z[n], zd[n], tau[N], zdd[n];
        for (int k = 0; k < n; k++) z[k] = pow(t->spread, k) * normal(), zd[k] = 5 * pow(t->spread, k) * normal();
        for (int i = 0; i < N; i++) tau[i] = forces ? normal() : 0;
        for (int k = 0; k < n; k++) {
            zdd[k] = t->f[k] + t->noise * normal();
            for (int j = 0; j < n; j++) zdd[k] -= t->K[k * n + j] * z[j] + t->C[k * n + j] * zd[j];
            for (int i = 0; i < N; i++) zdd[k] += t->B[i * n + k] * tau[i];
        }
        for (int i = 0; i < N; i++) {
            double q = t->offset[i], qd = 0, qdd = 0;
            for (int k = 0; k < n; k++) q += t->B[i * n + k] * z[k], qd += t->B[i * n + k] * zd[k], qdd += t->B[i * n + k] * zdd[k];
            m.q[r * N + i] = (roln_real)q, m.qd[r * N + i] = (roln_real)qd, m.qdd[r * N + i] = (roln_real)qdd;
            if (forces) m.tau[r * N + i] = (roln_real)normal(), m.tau_mid[r * N + i] = (roln_real)tau[i];
            mean[i] += q / ROWS;
        }
    }
    for (int i = 0; i < N; i++) m.mean[i] = (roln_real)mean[i];
    return m;
}

static void release(struct motion *m)
{
    free(m->q);
}

/* ---- operators ---- */

/* Worst error of qdd, relative to 1 + its largest entry, over random states and forces, on and off the subspace: there
   the component off it is ignored. */
static double worst_acceleration(const struct truth *t, const struct predictor *p)
{
    double worst = 0, top = 0;
    for (int trial = 0; trial < 200; trial++) {
        roln_real q[N], qd[N], tau[N], qdd[N];
        double zdd[n];
        for (int i = 0; i < N; i++) q[i] = (roln_real)normal(), qd[i] = (roln_real)normal(), tau[i] = (roln_real)normal();
        if (!CHECK(p->accelerate(p->self, q, qd, trial % 2 ? tau : NULL, qdd) == ROLN_OK)) return (double)INFINITY;
        for (int k = 0; k < n; k++) {
            zdd[k] = t->f[k];
            for (int i = 0; i < N; i++) {
                zdd[k] += trial % 2 ? t->B[i * n + k] * (double)tau[i] : 0;
                for (int j = 0; j < n; j++)
                    zdd[k] -= t->K[k * n + j] * t->B[i * n + j] * ((double)q[i] - t->offset[i])
                        + t->C[k * n + j] * t->B[i * n + j] * (double)qd[i];
            }
        }
        for (int i = 0; i < N; i++) {
            double want = 0;
            for (int k = 0; k < n; k++) want += t->B[i * n + k] * zdd[k];
            worst = fmax(worst, fabs((double)qdd[i] - want));
            top = fmax(top, fabs(want));
        }
    }
    return worst / (1 + top);
}

static void test_recovery(void)
{
    const double K[n] = {2, 9, 30}, C[n] = {.1, .4, 1}, rigid[n] = {0, 9, 30};
    for (int affine = 0; affine < 2; affine++)
        for (int forces = 0; forces < 2; forces++)
            for (int free_mode = 0; free_mode < 2; free_mode++) {
                struct truth t = system_of(affine, free_mode ? rigid : K, C, 0, .4);
                struct motion m = record(&t, forces);
                struct opinf *o;
                if (CHECK(opinf_fit(&o, affine, n, &m) == 0)) {
                    struct predictor p = opinf_predictor(o);
                    CHECK(p.N == N && p.state == 2 * n);
                    CHECK(opinf_params(o) == (affine ? 15 : 6));
                    CHECK_BELOW(worst_acceleration(&t, &p), 5e-7);
                    opinf_free(o);
                }
                release(&m);
            }
}

/* ---- optimality ---- */

static double V(const struct predictor *p, int i, double a, int j, double b)
{
    roln_real s[2 * n] = {0};
    double T, v;
    s[i] += (roln_real)a;
    s[j] += (roln_real)b;
    p->energy(p->self, s, &T, &v);
    return v;
}

/* The model read off its own functions: W from decode, K and f from V, C from qdd of q = mean. */
struct seen {
    double W[N * n], K[n * n], C[n * n], f[n];
};

static struct seen look(const struct predictor *p)
{
    struct seen x;
    const roln_real zero[2 * n] = {0};
    roln_real q0[N], q[N], qd[N], a0[N], a[N];
    CHECK(p->decode(p->self, zero, q0, qd) == ROLN_OK);
    CHECK(p->accelerate(p->self, q0, qd, NULL, a0) == ROLN_OK);
    for (int k = 0; k < n; k++) {
        roln_real s[2 * n] = {0};
        s[n + k] = 1;
        CHECK(p->decode(p->self, s, q, qd) == ROLN_OK);
        for (int i = 0; i < N; i++) x.W[i * n + k] = (double)qd[i];
        x.f[k] = (V(p, k, -1, k, 0) - V(p, k, 1, k, 0)) / 2;
        for (int j = 0; j < n; j++)
            x.K[k * n + j] = (V(p, k, 1, j, 1) + V(p, k, -1, j, -1) - V(p, k, 1, j, -1) - V(p, k, -1, j, 1)) / 4;
    }
    for (int k = 0; k < n; k++) {
        for (int i = 0; i < N; i++) qd[i] = (roln_real)x.W[i * n + k];
        CHECK(p->accelerate(p->self, q0, qd, NULL, a) == ROLN_OK);
        for (int j = 0; j < n; j++) {
            x.C[j * n + k] = 0;
            for (int i = 0; i < N; i++) x.C[j * n + k] += x.W[i * n + j] * (double)(a0[i] - a[i]);
        }
    }
    return x;
}

static double norm(int count, const double *x)
{
    double s = 0;
    for (int i = 0; i < count; i++) s += x[i] * x[i];
    return sqrt(s);
}

static double lowest(const double *A)
{
    roln_real S[n * n], Q[n * n], l[n], work[ROLN_EIG_WORK(n)];
    for (int i = 0; i < n * n; i++) S[i] = (roln_real)A[i];
    return roln_eig(n, S, l, Q, work) == ROLN_OK ? (double)l[0] : -(double)INFINITY;
}

/* gK = sum of sym(r z^T), gC of sym(r zd^T), gf of -r, with r = zdd + C zd + K z - f - W^T tau. */
static void gradient(const struct seen *x, const struct predictor *p, const struct motion *m, double *gK, double *gC, double *gf)
{
    memset(gK, 0, n * n * sizeof *gK);
    memset(gC, 0, n * n * sizeof *gC);
    memset(gf, 0, n * sizeof *gf);
    for (int row = 0; row < ROWS; row++) {
        roln_real s[2 * n];
        double r[n];
        CHECK(p->encode(p->self, m->q + row * N, m->qd + row * N, s) == ROLN_OK);
        for (int k = 0; k < n; k++) {
            r[k] = -x->f[k];
            for (int j = 0; j < n; j++) r[k] += x->K[k * n + j] * (double)s[j] + x->C[k * n + j] * (double)s[n + j];
            for (int i = 0; i < N; i++)
                r[k] += x->W[i * n + k] * (double)(m->qdd[row * N + i] - (m->tau ? m->tau_mid[row * N + i] : 0));
            gf[k] -= r[k];
        }
        for (int i = 0; i < n; i++)
            for (int j = 0; j < n; j++) {
                gK[i * n + j] += (r[i] * (double)s[j] + r[j] * (double)s[i]) / 2;
                gC[i * n + j] += (r[i] * (double)s[n + j] + r[j] * (double)s[n + i]) / 2;
            }
    }
}

/* X >= 0, its gradient G >= 0, <G, X> = 0; active: X has met the boundary and G is not 0. In coordinates of more equal size:
   of z_i / sqrt(spread^i), and X and G by the congruences that go with them. */
static void check_cone(double spread, double *X, double *G, int active)
{
    double dot = 0;
    for (int i = 0; i < n; i++)
        for (int j = 0; j < n; j++) {
            X[i * n + j] *= pow(spread, .5 * (i + j));
            G[i * n + j] /= ROWS * pow(spread, .5 * (i + j));
            dot += G[i * n + j] * X[i * n + j];
        }
    const double size = norm(n * n, X), force = size + norm(n * n, G);
    CHECK_BELOW(-lowest(X), 1e-6 * size);
    CHECK_BELOW(-lowest(G), 2e-5 * force);
    CHECK_BELOW(fabs(dot), 2e-5 * size * force);
    if (active) CHECK(norm(n * n, G) > .01 * size);
    else CHECK_BELOW(norm(n * n, G), 2e-5 * size);
}

/* Noise, so that the residual is not 0; true operators inside the cone and outside. Where no bound is met and C = 0 the
   gradient vanishes: K G + G K = -(A Z^T + Z A^T). */
static void test_optimality(void)
{
    const double K[2][n] = {{5, 9, 30}, {-20, 9, 30}}, C[2][n] = {{.3, 1, 4}, {-2, 1, 4}};
    for (int affine = 0; affine < 2; affine++)
        for (int outside = 0; outside < 2; outside++) {
            struct truth t = system_of(affine, K[outside], C[outside], .05, .1);
            struct motion m = record(&t, outside);
            struct opinf *o;
            if (CHECK(opinf_fit(&o, affine, n, &m) == 0)) {
                struct predictor p = opinf_predictor(o);
                struct seen x = look(&p);
                double gK[n * n], gC[n * n], gf[n];
                gradient(&x, &p, &m, gK, gC, gf);
                check_cone(t.spread, x.K, gK, outside);
                if (affine) check_cone(t.spread, x.C, gC, outside);
                if (affine) CHECK_BELOW(norm(n, gf), 1e-6 * ROWS * norm(n, x.f));
                if (!affine) CHECK(norm(n, x.f) == 0);
                opinf_free(o);
            }
            release(&m);
        }
}

/* ---- time steps ---- */

static struct opinf *fitted(int affine, struct truth *t)
{
    const double K[n] = {2, 9, 30}, C[n] = {.1, .4, 1};
    struct opinf *o = NULL;
    *t = system_of(affine, K, C, 0, .4);
    struct motion m = record(t, 1);
    CHECK(opinf_fit(&o, affine, n, &m) == 0);
    release(&m);
    return o;
}

static void test_energy(void)
{
    struct truth t;
    struct opinf *o = fitted(0, &t);
    if (!o) return;
    struct predictor p = opinf_predictor(o);
    roln_real s[2 * n] = {1, ROLN_C(-.5), ROLN_C(.2), 0, 1, 2};
    double T, U, worst = 0, swing = 0;
    p.energy(p.self, s, &T, &U);
    const double E = T + U, T0 = T;
    for (int k = 0; k < 5000; k++) {
        if (!CHECK(p.step(p.self, s, NULL, .05) == ROLN_OK)) break;
        p.energy(p.self, s, &T, &U);
        worst = fmax(worst, fabs(T + U - E) / E);
        swing = fmax(swing, fabs(T - T0) / E);
    }
    CHECK_BELOW(worst, 2e-5);
    CHECK(swing > .1);
    opinf_free(o);
}

/* q, qd at 2 s under a constant force, by steps of h */
static void roll(const struct predictor *p, const roln_real *q0, const roln_real *qd0, const roln_real *tau, int steps, double *x)
{
    roln_real s[2 * n], q[N], qd[N];
    CHECK(p->encode(p->self, q0, qd0, s) == ROLN_OK);
    for (int k = 0; k < steps; k++)
        if (!CHECK(p->step(p->self, s, tau, 2. / steps) == ROLN_OK)) break;
    CHECK(p->decode(p->self, s, q, qd) == ROLN_OK);
    for (int i = 0; i < N; i++) x[i] = (double)q[i], x[N + i] = (double)qd[i];
}

/* d/dt [q, qd] = [qd, accelerate] */
static void rate(const struct predictor *p, const double *x, const roln_real *tau, double *xd)
{
    roln_real q[N], qd[N], qdd[N];
    for (int i = 0; i < N; i++) q[i] = (roln_real)x[i], qd[i] = (roln_real)x[N + i];
    CHECK(p->accelerate(p->self, q, qd, tau, qdd) == ROLN_OK);
    for (int i = 0; i < N; i++) xd[i] = x[N + i], xd[N + i] = (double)qdd[i];
}

/* The same by RK4 in the full coordinates. */
static void reference(const struct predictor *p, const roln_real *q0, const roln_real *qd0, const roln_real *tau, double *x)
{
    const double c[4] = {0, .5, .5, 1}, w[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const int steps = 1000;
    for (int i = 0; i < N; i++) x[i] = (double)q0[i], x[N + i] = (double)qd0[i];
    for (int k = 0; k < steps; k++) {
        double at[2 * N], xd[2 * N] = {0}, sum[2 * N] = {0};
        for (int a = 0; a < 4; a++) {
            for (int i = 0; i < 2 * N; i++) at[i] = x[i] + c[a] * 2 / steps * xd[i];
            rate(p, at, tau, xd);
            for (int i = 0; i < 2 * N; i++) sum[i] += w[a] * xd[i];
        }
        for (int i = 0; i < 2 * N; i++) x[i] += 2. / steps * sum[i];
    }
}

static void test_order(void)
{
    struct truth t;
    struct opinf *o = fitted(1, &t);
    if (!o) return;
    struct predictor p = opinf_predictor(o);
    roln_real q0[N], qd0[N], tau[N];
    double want[2 * N], x[2 * N], error[3], back = 0;
    for (int i = 0; i < N; i++) {
        double q = t.offset[i], qd = 0;
        for (int k = 0; k < n; k++) q += t.B[i * n + k] * (.3 + k), qd += t.B[i * n + k] * (1 - k);
        q0[i] = (roln_real)q, qd0[i] = (roln_real)qd, tau[i] = (roln_real)(3 * normal());
    }
    reference(&p, q0, qd0, tau, want);
    for (int k = 0; k < 3; k++) {
        roll(&p, q0, qd0, tau, 80 << k, x);
        for (int i = 0; i < 2 * N; i++) x[i] -= want[i];
        error[k] = norm(2 * N, x);
    }
    CHECK_NEAR(error[0] / error[1], 4, .1);
    CHECK_NEAR(error[1] / error[2], 4, .1);
    roll(&p, q0, qd0, tau, 0, x);       /* on the subspace decoding undoes encoding */
    for (int i = 0; i < N; i++) back = fmax(back, fmax(fabs(x[i] - (double)q0[i]), fabs(x[N + i] - (double)qd0[i])));
    CHECK_BELOW(back, 1e-6);
    opinf_free(o);
}

/* ---- what cannot be fitted ---- */

static void refused(int affine, int r, const struct motion *m)
{
    struct opinf *o = NULL;
    CHECK(opinf_fit(&o, affine, r, m) == -1);
    CHECK(o == NULL);
    opinf_free(o);
}

static void test_refusals(void)
{
    const double K[n] = {2, 9, 30}, C[n] = {.1, .4, 1};
    for (int affine = 0; affine < 2; affine++) {
        struct truth t = system_of(affine, K, C, 0, .4);
        struct motion m = record(&t, 1);
        roln_real *const arrays[4] = {m.q, m.qdd, m.tau_mid, m.qd};
        const roln_real bad[2] = {(roln_real)NAN, (roln_real)INFINITY};
        for (int a = 0; a < 3 + affine; a++)    /* the published form does not read qd */
            for (int b = 0; b < 2; b++) {
                roln_real *const x = arrays[a] + 1234, good = *x;
                *x = bad[b];
                refused(affine, n, &m);
                *x = good;
            }
        refused(affine, n + 1, &m);     /* one more than the data span */
        refused(affine, 0, &m);
        refused(affine, N + 1, &m);
        for (int i = 0; i < ROWS * N; i++) m.qd[i] = 2 * (m.q[i] - m.mean[i % N]);
        if (affine) refused(affine, n, &m);     /* K and C do the same */
        release(&m);
    }
}

/* A step of 0 s changes nothing; one that has no matrix or no result is reported and leaves the state as it was. */
static void test_status(void)
{
    struct truth t;
    struct opinf *o = fitted(0, &t);
    if (!o) return;
    struct predictor p = opinf_predictor(o);
    roln_real s[2 * n] = {0, 0, 0, ROLN_C(3e38), 0, 0};
    const roln_real start[2 * n] = {0, 0, 0, ROLN_C(3e38), 0, 0};
    CHECK(p.step(p.self, s, NULL, 0) == ROLN_OK);
    CHECK(memcmp(s, start, sizeof s) == 0);
    CHECK(p.step(p.self, s, NULL, (double)NAN) == ROLN_E_ILL_CONDITIONED);
    CHECK(memcmp(s, start, sizeof s) == 0);
    s[n + 1] = (roln_real)NAN;
    CHECK(p.step(p.self, s, NULL, .1) == ROLN_E_NOT_FINITE);
    CHECK(s[n] == start[n]);
    opinf_free(o);
}

int main(void)
{
    test_recovery();
    test_optimality();
    test_energy();
    test_order();
    test_refusals();
    test_status();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
