/* SPDX-License-Identifier: MIT */
/* differences.h - derivatives of a table of models against central differences: gradients, rows of Gauss-Newton and linearised
   steps. Halving the step of a difference quarters its error. A step of a model against a slow one. Include after samples.h; CALLED
   has dynamics, grad, grad_acc, rows, step, linear, push, slopes; the models have 3 rows and learn everything. */
#ifndef DIFFERENCES_H
#define DIFFERENCES_H

static roln_real theta_k[MAXP];

/* NAME_write into a text [TEXT] that begins anew where text_at is set to 0. */
enum { TEXT = 40000 };
static size_t text_at;
ROLN_FN void put_text(void *ctx, const char *what)
{
    text_at += (size_t)snprintf((char *)ctx + text_at, TEXT - text_at, "%s", what);
}

#ifdef ROLN_DOUBLE
/* Two differences, of steps h and h / 2, against a derivative: errors of second order. */
typedef struct {
    double error[2], of; /* sums over all numbers */
} halving;

ROLN_FN void halve(halving *x, const double plus[2], const double minus[2], double h, double g)
{
    double e[2];
    int q;
    for (q = 0; q < 2; q++) {
        const double d = q ? h / 2 : h;
        e[q] = fabs((plus[q] - minus[q]) / (2 * d) - g);
        x->error[q] += e[q];
    }
    x->of += fabs(g);
    CHECK_BELOW(e[1], 0.27 * e[0] + 1e-11 / h * (1 + fabs(plus[0])));
}

ROLN_FN void halved(const halving *x)
{
    CHECK(x->of > 0);
    CHECK_BELOW(x->error[1], 1e-4 * x->of);
    if (x->error[0] > 1e-6) CHECK_NEAR(x->error[0] / x->error[1], 4, 0.3);
}

/* The first parameter that is learned: an autoencoder that keeps numbers is not. */
ROLN_FN int learned_from(int k)
{
    return models[k]->md->ae.keeps > 0 ? roln_ae_params(&models[k]->md->ae) : 0;
}

/* The gradient of a kind of loss by every parameter that is learned; 0 by the others. */
ROLN_FN void check_gradient(int k, int kind, uint64_t *seed)
{
    static data d;
    static gradient g, at;
    const instance m = trained(models[k], scale_of(k), theta_k);
    const double h = 2e-3;
    halving x;
    int i, p;
    memset(&x, 0, sizeof x);
    make(k, kind, 3, seed, &d);
    CHECK_OK(grad_of(&m, &d, &g));
    CHECK(all(learned_from(k), g.theta, 0));
    for (i = learned_from(k); i < models[k]->params; i++) {
        const int j = mate(k, i);
        const double was = theta_k[i];
        double plus[2], minus[2];
        if (j < i) continue;
        for (p = 0; p < 4; p++) {
            theta_k[i] = theta_k[j] = was + (p < 2 ? 1 : -1) * (p % 2 ? h / 2 : h);
            CHECK_OK(grad_of(&m, &d, &at));
            (p < 2 ? plus : minus)[p % 2] = weighted(&at.t);
        }
        theta_k[i] = theta_k[j] = was;
        halve(&x, plus, minus, h, i == j ? g.theta[i] : g.theta[i] + g.theta[j]);
    }
    halved(&x);
}

/* Rows of Gauss-Newton: the derivatives of residuals by every parameter, under the same signs. */
ROLN_FN void check_rows(int k, int kind, uint64_t *seed)
{
    enum { ROWS = 3 };
    static data d;
    static double J[ROWS * MAXP], r[ROWS], at[ROWS];
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int from = learned_from(k), P = models[k]->params - from;
    roln_real *const work = is_acc(kind) ? ROOM(grad_acc) : ROOM(grad);
    const double h = 2e-3;
    halving x;
    int i, p, w;
    memset(&x, 0, sizeof x);
    make(k, kind, ROWS, seed, &d);
    CHECK_OK(m.of->rows(&m, &weights.loss, &d.b, d.h, 40, J, r, work));
    for (i = from; i < P + from; i++) {
        const int j = mate(k, i);
        const double was = theta_k[i];
        double plus[ROWS][2], minus[ROWS][2];
        if (j < i) continue;
        for (p = 0; p < 4; p++) {
            theta_k[i] = theta_k[j] = was + (p < 2 ? 1 : -1) * (p % 2 ? h / 2 : h);
            CHECK_OK(m.of->rows(&m, &weights.loss, &d.b, d.h, 40, NULL, at, work));
            for (w = 0; w < ROWS; w++)
                (p < 2 ? plus : minus)[w][p % 2] = -at[w];
        }
        theta_k[i] = theta_k[j] = was;
        for (w = 0; w < ROWS; w++)
            halve(&x, plus[w], minus[w], h, i == j ? J[w * P + i - from] : J[w * P + i - from] + J[w * P + j - from]);
    }
    halved(&x);
}

/* A and B of a model of the table. */
ROLN_FN void check_jacobian(const model *of, const roln_scale *sc, uint64_t *seed)
{
    static double A[256], B[512];
    const instance m = trained(of, sc, theta_k);
    const int n = of->n, n2 = 2 * n, F = of->force_size;
    double s[64], to[4][64], y[64];
    const double h = 1e-3;
    halving x;
    int i, j, p;
    memset(&x, 0, sizeof x);
    dyadic(n2 + F, 1, seed, s);
    memcpy(y, s, sizeof y);
    CHECK_OK(m.of->linear(&m, y, y + n, s + n2, dt / 8, A, B, spare));
    for (j = 0; j < n2 + F; j++) {
        const double was = s[j];
        for (p = 0; p < 4; p++) {
            s[j] = was + (p < 2 ? 1 : -1) * (p % 2 ? h / 2 : h);
            memcpy(to[p], s, sizeof s);
            CHECK_OK(m.of->step(&m, to[p], to[p] + n, s + n2, dt / 8, spare));
        }
        s[j] = was;
        for (i = 0; i < n2; i++) {
            const double plus[2] = {to[0][i], to[1][i]}, minus[2] = {to[2][i], to[3][i]};
            halve(&x, plus, minus, h, j < n2 ? A[i * n2 + j] : B[i * F + j - n2]);
        }
    }
    halved(&x);
}

/* A and L of a step under inputs and a load. */
ROLN_FN void check_load_jacobian(int k, uint64_t *seed)
{
    static double A[256], L[512];
    const instance m = trained(models[k], scale_of(k), theta_k);
    const slopes_at slopes = {A, NULL, L};
    const int n = n_OF(k), n2 = 2 * n;
    double s[64], u[MAXN], to[4][64], y[64];
    const double h = 1e-3;
    halving x;
    int i, j, p;
    memset(&x, 0, sizeof x);
    dyadic(3 * n, 1, seed, s), dyadic(F_OF(k), 1, seed, u);
    memcpy(y, s, sizeof y);
    CHECK_OK(m.of->slopes(&m, y, y + n, u, s + n2, dt / 8, &slopes, spare));
    for (j = 0; j < 3 * n; j++) {
        const double was = s[j];
        for (p = 0; p < 4; p++) {
            s[j] = was + (p < 2 ? 1 : -1) * (p % 2 ? h / 2 : h);
            memcpy(to[p], s, sizeof s);
            CHECK_OK(m.of->push(&m, to[p], to[p] + n, u, s + n2, dt / 8, spare));
        }
        s[j] = was;
        for (i = 0; i < n2; i++) {
            const double plus[2] = {to[0][i], to[1][i]}, minus[2] = {to[2][i], to[3][i]};
            halve(&x, plus, minus, h, j < n2 ? A[i * n2 + j] : L[i * n + j - n2]);
        }
    }
    halved(&x);
}
#endif

/* A without B has the bits of A beside B, and a load of 0 is none. */
ROLN_FN void check_slopes(int k, uint64_t *seed)
{
    static roln_real A[3][256], B[512], L[512], none[MAXN], s[4][2 * MAXN], u[MAXN];
    const instance m = trained(models[k], scale_of(k), theta_k);
    const slopes_at by_state = {A[1], NULL, NULL}, by_load = {A[2], NULL, L};
    const int n = n_OF(k), nn = 4 * n * n;
    int i;
    dyadic(2 * n, 1, seed, s[0]), dyadic(F_OF(k), 1, seed, u), fill(512, 7, L);
    for (i = 1; i < 4; i++) memcpy(s[i], s[0], sizeof s[0]);
    CHECK_OK(m.of->linear(&m, s[1], s[1] + n, u, dt / 8, A[0], B, ROOM(linear)));
    CHECK_OK(m.of->slopes(&m, s[2], s[2] + n, u, NULL, dt / 8, &by_state, spare));
    CHECK_OK(m.of->slopes(&m, s[3], s[3] + n, u, none, dt / 8, &by_load, spare));
    CHECK(same(2 * n, s[1], s[2]) && same(2 * n, s[1], s[3]) && !same(2 * n, s[0], s[1]));
    CHECK(same(nn, A[0], A[1]) && same(nn, A[0], A[2]));
    CHECK(largest(2 * n * n, L) > 0 && all(512 - 2 * n * n, L + 2 * n * n, 7));
}

/* zdd [n] from the definition: M zdd + c + g + d = tau_z, where the last `driven` numbers of tau_z are accelerations and the forces
   that make them are unknown, in one system of equations. */
ROLN_FN void slow_motion(int k, const instance *m, const roln_real *z, const roln_real *zd, const ld *tau_z, int driven, ld *zdd)
{
    const int n = n_OF(k), side = n + driven;
    roln_real M[64], c[MAXN], g[MAXN], d[MAXN];
    const terms_at out = {M, c, g, d, NULL, NULL};
    ld K[400], x[20];
    int i, j;
    CHECK_OK(m->of->dynamics(m, z, zd, &out, ROOM(dynamics)));
    for (i = 0; i < side; i++) {
        for (j = 0; j < side; j++)
            K[i * side + j] = i < n && j < n ? (ld)M[i * n + j] : (i < n ? j - driven == i : i - driven == j) ? 1 : 0;
        x[i] = i < n - driven ? tau_z[i] : i < n ? 0 : tau_z[i - driven];
        if (i < n) x[i] -= (ld)c[i] + (ld)g[i] + (ld)d[i];
    }
    t_solve(side, 1, K, x);
    for (i = 0; i < n; i++) zdd[i] = x[i];
}

/* tau_z of z, zd under the inputs u. */
typedef void (*slow_force)(int k, const instance *m, const roln_real *z, const roln_real *zd, const roln_real *u, ld *tau_z);

/* A step of Euler's or of the classical method of order 4 by slow_motion; s [2n] in and out. */
ROLN_FN void slow_step(int k, const instance *m, int driven, slow_force force, const roln_real *u, ld h, ld *s)
{
    static const ld part[4] = {1.0L / 6, 1.0L / 3, 1.0L / 3, 1.0L / 6}, move[4] = {0, 0.5L, 0.5L, 1};
    const int n = n_OF(k), stages = models[k]->md->scheme == ROLN_EULER ? 1 : 4;
    ld sum[2 * MAXN] = {0}, slope[2 * MAXN] = {0}, tau_z[MAXN];
    int i, j;
    for (j = 0; j < stages; j++) {
        roln_real z[MAXN], zd[MAXN];
        for (i = 0; i < n; i++) {
            z[i] = (roln_real)(s[i] + move[j] * h * slope[i]);
            zd[i] = (roln_real)(s[n + i] + move[j] * h * slope[n + i]);
        }
        force(k, m, z, zd, u, tau_z);
        for (i = 0; i < n; i++) slope[i] = (ld)zd[i];
        slow_motion(k, m, z, zd, tau_z, driven, slope + n);
        for (i = 0; i < 2 * n; i++) sum[i] += (stages == 1 ? 1 : part[j]) * slope[i];
    }
    for (i = 0; i < 2 * n; i++) s[i] += h * sum[i];
}

/* A step of every model against the slow one, in eps. */
ROLN_FN void check_step(int k, int driven, slow_force force, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real s[2 * MAXN], u[MAXN];
    ld x[2 * MAXN];
    dyadic(2 * n, 1, seed, s), dyadic(F_OF(k), 1, seed, u);
    widen(2 * n, s, x);
    slow_step(k, &m, driven, force, u, (ld)dt / 8, x);
    CHECK_OK(m.of->step(&m, s, s + n, u, dt / 8, ROOM(step)));
    ROOM_KEPT();
    BOUND("a step, eps", distance(2 * n, s, x) / EPS, 20);
}

#endif
