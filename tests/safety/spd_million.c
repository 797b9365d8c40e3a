/* SPDX-License-Identifier: MIT */
/* spd_million.c - a million symmetric matrices of 1 to 8 rows, with equal, clustered, graded, nearly singular, huge and tiny
   eigenvalues, through Cholesky, solve, inverse, and the maps exp, log and powers with their derivatives, against twins in the next
   wider type (cyclic Jacobi, Gauss with pivots): the worst error in the units of the bounds in roln_spd.h. Float, or double with
   -DROLN_DOUBLE. An argument: another number of matrices. Last line: N passed, N failed. Progress on stderr. */
#include "roln_spd.h"
#include "twin.h"

#include <stdlib.h>

#ifdef ROLN_DOUBLE
#define WIDE(f) f##l
#else
#define WIDE(f) f
#endif

enum { N = 8, NN = N * N };
enum { CHOL, SOLVE, INVERSE, MAP, DERIVATIVE = MAP + 6, ROWS = DERIVATIVE + 6 };
static const struct {
    const char *name;
    double bound;
} rows[ROWS] = {{"roln_chol", 1}, {"its solve", 1}, {"roln_inv", 1}, {"exp", 8}, {"log", 8}, {"power 1/2", 8}, {"power -1/2", 8},
                {"power -1", 8}, {"power 1/3", 8}, {"exp, derivative", 3}, {"log, derivative", 3}, {"power 1/2, derivative", 3},
                {"power -1/2, derivative", 3}, {"power -1, derivative", 3}, {"power 1/3, derivative", 3}};
static struct {
    double error;
    long matrices, refused, failed;
} seen[ROWS];

/* Eigenvalues: all equal, equal but for eps, in two clusters, graded, of any size, one nearly 0, within a decade. */
enum { EQUAL, NEARLY, CLUSTERS, GRADED, ANY, ONE, CLOSE, SPECTRA };

typedef struct {
    int n;
    roln_real X[NN];
    t_wide x[NN], l[N], V[NN]; /* X, its eigenvalues, ascending, eigenvectors in rows */
} matrix;

/* l, V of x. */
static void jacobi(matrix *m)
{
    const int n = m->n;
    t_wide a[NN], top = 0;
    int i, k, p, q, sweep, turned = 1;
    for (i = 0; i < n * n; i++) {
        a[i] = m->x[i], m->V[i] = i % (n + 1) == 0;
        if (t_abs(a[i]) > top) top = t_abs(a[i]);
    }
    for (sweep = 0; sweep < 60 && turned; sweep++)
        for (turned = 0, p = 0; p < n; p++)
            for (q = p + 1; q < n; q++) {
                const t_wide apq = a[p * n + q], d = a[q * n + q] - a[p * n + p];
                t_wide t, c, s;
                if (t_abs(apq) <= (t_wide)1e-9 * (t_wide)EPS * t_sqrt(t_abs(a[p * n + p])) * t_sqrt(t_abs(a[q * n + q])) ||
                    t_abs(apq) <= (t_wide)1e-18 * (t_wide)EPS * top)
                    continue;
                t = d / (2 * apq);
                t = (t < 0 ? -1 : 1) / (t_abs(t) + t_sqrt(1 + t * t));
                c = 1 / t_sqrt(1 + t * t), s = t * c, turned = 1;
                for (i = 0; i < n; i++) {
                    const t_wide u = a[p * n + i], v = a[q * n + i], f = m->V[p * n + i], g = m->V[q * n + i];
                    a[p * n + i] = c * u - s * v, a[q * n + i] = s * u + c * v;
                    m->V[p * n + i] = c * f - s * g, m->V[q * n + i] = s * f + c * g;
                }
                for (i = 0; i < n; i++) {
                    const t_wide u = a[i * n + p], v = a[i * n + q];
                    a[i * n + p] = c * u - s * v, a[i * n + q] = s * u + c * v;
                }
            }
    for (i = 0; i < n; i++) {
        for (p = i, k = i + 1; k < n; k++)
            if (a[k * (n + 1)] < a[p * (n + 1)]) p = k;
        m->l[i] = a[p * (n + 1)], a[p * (n + 1)] = a[i * (n + 1)];
        for (k = 0; k < n; k++) {
            const t_wide v = m->V[i * n + k];
            m->V[i * n + k] = m->V[p * n + k], m->V[p * n + k] = v;
        }
    }
}

/* A <- Q A Q^T with a random reflection Q. */
static void reflect(int n, t_wide *A, uint64_t *s)
{
    t_wide v[N], vv = 0, w[N];
    int side, i, j;
    for (i = 0; i < n; i++) v[i] = (t_wide)roln_normal(s) + (t_wide)1e-3, vv += v[i] * v[i];
    for (side = 0; side < 2; side++) {
        for (i = 0; i < n; i++)
            for (w[i] = 0, j = 0; j < n; j++) w[i] += 2 * v[j] / vv * (side ? A[i * n + j] : A[j * n + i]);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) *(side ? A + i * n + j : A + j * n + i) -= w[i] * v[j];
    }
}

/* A matrix of one of the spectra, of a condition up to far / n eps, times a scale; for exp: exponents, across at most `span`. */
static void draw(matrix *m, int spectrum, int exponents, ld far, uint64_t *s)
{
    const int n = 1 + roln_randint(N, s);
    const ld digits = log10l(far / ((ld)n * EPS)), k = digits * (ld)roln_uniform(s);
    const ld scale = exponents ? 1 : powl(10, PICK(10, 90) * (2 * (ld)roln_uniform(s) - 1));
    const ld span = PICK(13.9L, 31.9L) * (ld)roln_uniform(s), middle = (40 - span) * (2 * (ld)roln_uniform(s) - 1) * 0.49L;
    t_wide a[NN] = {0};
    int i, j;
    m->n = n;
    for (i = 0; i < n; i++) {
        const ld at = n > 1 ? (ld)i / (ld)(n - 1) : 0;
        ld e; /* 0 .. 1 */
        switch (spectrum) {
        case EQUAL: e = 0; break;
        case NEARLY: e = (ld)roln_randint(5, s) * EPS; break;
        case CLUSTERS: e = (i < n / 2) + (ld)roln_randint(3, s) * EPS; break;
        case GRADED: e = at; break;
        case ANY: e = (ld)roln_uniform(s); break;
        case ONE: e = i == 0; break;
        default: e = (ld)roln_uniform(s) / PICK(6, 15);
        }
        a[i * (n + 1)] = (t_wide)(exponents ? middle + span * (e - 0.5L) : scale * powl(10, -k * e));
    }
    for (i = roln_randint(3, s); i > 0 && n > 1; i--) reflect(n, a, s); /* some stay diagonal */
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            m->X[i * n + j] = m->X[j * n + i] = (roln_real)((a[i * n + j] + a[j * n + i]) / 2);
            m->x[i * n + j] = m->x[j * n + i] = (t_wide)m->X[i * n + j];
        }
    jacobi(m);
}

static void note(int row, double error)
{
    seen[row].matrices++;
    if (!(error <= seen[row].error)) seen[row].error = error;
    seen[row].failed += !(error <= rows[row].bound);
}

/* f of row `map`, its derivatives of order 1, 2, and f[a, b]. */
static const double power[6] = {0, 0, 0.5, -0.5, -1, 1.0 / 3};
static t_wide value(int map, int order, t_wide x)
{
    const t_wide p = map == 5 ? (t_wide)(roln_real)power[5] : (t_wide)power[map];
    if (map == 0) return WIDE(exp)(x);
    if (map == 1) return order == 0 ? WIDE(log)(x) : order == 1 ? 1 / x : -1 / x / x;
    return WIDE(pow)(x, p - order) * (order == 0 ? 1 : order == 1 ? p : p * (p - 1));
}

static t_wide difference(int map, t_wide a, t_wide b)
{
    const t_wide p = map == 5 ? (t_wide)(roln_real)power[5] : (t_wide)power[map], d = a - b;
    if (t_abs(d) <= (t_wide)1e-14 * (t_wide)EPS * t_abs(a)) return value(map, 1, a);
    if (map == 0) return WIDE(exp)(b) * WIDE(expm1)(d) / d;
    if (map == 1) return WIDE(log1p)(d / b) / d;
    return WIDE(pow)(b, p) * WIDE(expm1)(p * WIDE(log1p)(d / b)) / d;
}

static void check_map(const matrix *m, int map, uint64_t *s)
{
    static const int kind[6] = {ROLN_EXP, ROLN_LOG, ROLN_POWER, ROLN_POWER, ROLN_POWER, ROLN_POWER};
    const roln_real p = (roln_real)power[map];
    const int n = m->n;
    roln_real Y[NN], E[NN], D[NN], K[NN], V[NN], W[NN], l[N], f[N], work[ROLN_SPD_MAP_WORK(N)];
    t_wide F[NN], most[3] = {0, 0, 0}, top = 0, e[2] = {0, 0}, size = 0, rounded = 1;
    int i, j, k, q;
    roln_status st = roln_spd_map(n, kind[map], p, NULL, m->X, Y, work);
    if (st != ROLN_OK) { /* only at the edge of what is refused */
        const int edge = map == 0 ? m->l[n - 1] - m->l[0] > PICK(13.8, 31.8)
                                  : !(m->l[0] > 2 * (t_wide)n * (t_wide)EPS * m->l[n - 1]);
        seen[MAP + map].refused++, seen[MAP + map].failed += !edge;
        return;
    }
    for (i = 0; i < n; i++) {
        for (q = 0; q < 3; q++)
            if (t_abs(value(map, q, m->l[i])) > most[q]) most[q] = t_abs(value(map, q, m->l[i]));
        if (t_abs(m->l[i]) > top) top = t_abs(m->l[i]);
    }
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) E[i * n + j] = E[j * n + i] = roln_normal(s);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            t_wide x = 0;
            size += (t_wide)E[i * n + j] * (t_wide)E[i * n + j];
            for (k = 0; k < n; k++)
                for (q = 0; q < n; q++) x += m->V[i * n + k] * (t_wide)E[k * n + q] * m->V[j * n + q];
            F[i * n + j] = difference(map, m->l[i], m->l[j]) * x;
        }
    st = roln_spd_frame(n, NULL, m->X, l, V, W, work);
    if (st == ROLN_OK) st = roln_map_values(n, kind[map], p, l, f);
    if (st != ROLN_OK) {
        seen[DERIVATIVE + map].failed++;
        return;
    }
    for (i = 0; i < n && map == 5; i++) { /* l^p = e^(p log l): its error, too */
        const t_wide more = 1 + t_abs(value(1, 0, m->l[i]) * (t_wide)p);
        if (more > rounded) rounded = more;
    }
    roln_map_dd1(n, kind[map], p, l, f, K);
    roln_spd_map_d(n, K, V, W, E, D, work);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            t_wide y = 0, d = 0;
            for (k = 0; k < n; k++) {
                y += m->V[k * n + i] * value(map, 0, m->l[k]) * m->V[k * n + j];
                for (q = 0; q < n; q++) d += m->V[k * n + i] * F[k * n + q] * m->V[q * n + j];
            }
            y = t_abs((t_wide)Y[i * n + j] - y), d = t_abs((t_wide)D[i * n + j] - d);
            if (!(y <= e[0])) e[0] = y;
            if (!(d <= e[1])) e[1] = d;
        }
    note(MAP + map, (double)(e[0] / ((t_wide)n * (t_wide)EPS * (top * most[1] + rounded * most[0]))));
    note(DERIVATIVE + map, (double)(e[1] / ((t_wide)n * (t_wide)EPS * (top * most[2] + rounded * most[1]) * t_sqrt(size))));
}

/* Units: of Cholesky (n + 2) eps/2 sqrt(A_ii A_jj), of the solution the same times 3 |x_j|, of the inverse n eps |A|_1 |X|_1. */
static void check_solve(const matrix *m, uint64_t *s)
{
    const int n = m->n;
    const t_wide unit = (t_wide)(n + 2) * (t_wide)EPS / 2;
    roln_real L[NN], b[N], x[N] = {0}, X[NN], work[ROLN_INV_WORK(N)];
    t_wide e[3] = {0, 0, 0}, na = 0, nx = 0, top = 0;
    int i, j, k;
    if (roln_chol(n, m->X, L) != ROLN_OK) {
        t_wide least;
        matrix h = *m; /* scaled to a diagonal of 1 it is singular to rounding */
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) h.x[i * n + j] /= t_sqrt(m->x[i * (n + 1)]) * t_sqrt(m->x[j * (n + 1)]);
        jacobi(&h);
        least = h.l[0];
        seen[CHOL].refused++, seen[CHOL].failed += least > (t_wide)n * unit;
        return;
    }
    for (i = 0; i < n; i++) b[i] = roln_normal(s) * m->X[i * (n + 1)];
    roln_solve_lower(n, L, b, x);
    roln_solve_lower_t(n, L, x, x);
    for (i = 0; i < n; i++) {
        t_wide r = (t_wide)b[i], scale = 0;
        for (j = 0; j < n; j++) {
            const t_wide root = t_sqrt(m->x[i * (n + 1)]) * t_sqrt(m->x[j * (n + 1)]);
            t_wide d = m->x[i * n + j];
            for (k = 0; k < n; k++) d -= (t_wide)L[i * n + k] * (t_wide)L[j * n + k];
            if (!(t_abs(d) / root <= e[0])) e[0] = t_abs(d) / root;
            r -= m->x[i * n + j] * (t_wide)x[j], scale += root * t_abs((t_wide)x[j]);
        }
        if (scale > 0 && !(t_abs(r) / scale <= e[1])) e[1] = t_abs(r) / scale;
    }
    note(CHOL, (double)(e[0] / unit));
    note(SOLVE, (double)(e[1] / (3 * unit)));
    if (roln_inv(n, m->X, X, work) != ROLN_OK) {
        seen[INVERSE].refused++, seen[INVERSE].failed += 1024 * (t_wide)n * (t_wide)n * (t_wide)EPS * m->l[n - 1] < m->l[0];
        return;
    }
    for (i = 0; i < n; i++) {
        t_wide ca = 0, cx = 0;
        for (j = 0; j < n; j++) {
            t_wide y = 0;
            for (k = 0; k < n; k++) y += m->V[k * n + i] / m->l[k] * m->V[k * n + j];
            ca += t_abs(m->x[i * n + j]), cx += t_abs(y);
            if (t_abs(y) > top) top = t_abs(y);
            if (!(t_abs((t_wide)X[i * n + j] - y) <= e[2])) e[2] = t_abs((t_wide)X[i * n + j] - y);
        }
        na = ca > na ? ca : na, nx = cx > nx ? cx : nx;
    }
    note(INVERSE, (double)(e[2] / (top * (t_wide)n * (t_wide)EPS * na * nx)));
}

int main(int argc, char **argv)
{
    const long count = argc > 1 ? atol(argv[1]) : 1000000;
    uint64_t seed = 30;
    long done, passed = 0, failed = 0;
    int row;
    for (done = 0; done < count; done++) {
        static matrix m;
        const int spectrum = (int)(done % SPECTRA), map = (int)(done / SPECTRA % 7);
        draw(&m, spectrum, map == 0, map < 6 ? 0.4L : 40, &seed);
        if (map < 6) check_map(&m, map, &seed);
        else check_solve(&m, &seed);
        if (done % (count / 100 + 1) == 0) fprintf(stderr, "\r%ld %% of %ld matrices", 100 * done / count, count);
    }
    fprintf(stderr, "\r");
    for (row = 0; row < ROWS; row++) {
        printf("| %-24s | " TEST_PRECISION " | %8ld | %6ld | %6.3f | %g |%s\n", rows[row].name, seen[row].matrices,
               seen[row].refused, seen[row].error, rows[row].bound, seen[row].failed ? " failed" : "");
        passed += seen[row].matrices, failed += seen[row].failed + (seen[row].matrices == 0);
    }
    printf("%ld passed, %ld failed\n", passed - failed, failed);
    return failed != 0;
}
