/* SPDX-License-Identifier: MIT */
/* Riccati equations, roln_spd.h section 10: triangles; roln_dare against the plain fixed-point iteration in long double, the
   equation itself and closed forms; what cannot be stabilised; roln_riccati along a time-varying system against one dense least
   squares problem over all of its steps. */
#include "roln_spd.h"
#include "twin.h"
#include "room.h"

void TEST_NAME(riccati)(void);

enum { MAXN = 16, MAXM = 18, STEPS = 6 };

/* A problem: sizes, what roln_dare takes, and the same in long double. */
typedef struct {
    int n, m;
    roln_real A[MAXN * MAXN], B[MAXN * MAXM], D[MAXN * MAXN], r[MAXM], C[MAXN * MAXN], K[MAXM * MAXN];
} problem;

typedef struct {
    ld A[MAXN * MAXN], B[MAXN * MAXM], Q[MAXN * MAXN], X[MAXN * MAXN], K[MAXM * MAXN];
} twin;

/* c [a][d] = A [a][b] B [b][d]; with t A is [b][a], transposed. */
static void times(int a, int b, int d, int t, const ld *A, const ld *B, ld *c)
{
    int i, j, k;
    for (i = 0; i < a; i++)
        for (j = 0; j < d; j++)
            for (c[i * d + j] = 0, k = 0; k < b; k++)
                c[i * d + j] += A[t ? k * a + i : i * b + k] * B[k * d + j];
}

/* Normal numbers: A of spectral radius about `grow`, weights near 1, those of the inputs near `price`. D is full. */
static void draw(int n, int m, double grow, double price, uint64_t *s, problem *p)
{
    int i;
    p->n = n, p->m = m;
    for (i = 0; i < n * n; i++)
        p->A[i] = (roln_real)(grow / sqrt(n)) * roln_normal(s);
    for (i = 0; i < n * m; i++)
        p->B[i] = roln_normal(s);
    for (i = 0; i < n * n; i++)
        p->D[i] = roln_normal(s) / 4 + (i % (n + 1) == 0);
    for (i = 0; i < m; i++)
        p->r[i] = (roln_real)price * (roln_uniform(s) + ROLN_C(0.5));
}

static void widen_all(const problem *p, twin *t)
{
    static ld D[MAXN * MAXN];
    const int n = p->n;
    widen(n * n, p->A, t->A), widen(n * p->m, p->B, t->B), widen(n * n, p->D, D);
    times(n, n, n, 1, D, D, t->Q);
    memcpy(t->X, t->Q, sizeof t->X);
}

/* K of X, and to next the cost in front of a step, Q + (A - B K)^T X (A - B K) + K^T R K. */
static void back(const problem *p, twin *t, ld *next)
{
    static ld XB[MAXN * MAXM], XA[MAXN * MAXN], S[MAXM * MAXM], F[MAXN * MAXN], XF[MAXN * MAXN];
    const int n = p->n, m = p->m;
    int i, k;
    times(n, n, m, 0, t->X, t->B, XB);
    times(n, n, n, 0, t->X, t->A, XA);
    times(m, n, m, 1, t->B, XB, S);
    times(m, n, n, 1, t->B, XA, t->K);
    for (i = 0; i < m; i++)
        S[i * m + i] += (ld)p->r[i];
    t_solve(m, n, S, t->K);
    times(n, m, n, 0, t->B, t->K, F);
    for (i = 0; i < n * n; i++)
        F[i] = t->A[i] - F[i];
    times(n, n, n, 0, t->X, F, XF);
    times(n, n, n, 1, F, XF, next);
    for (i = 0; i < n * n; i++)
        for (next[i] += t->Q[i], k = 0; k < m; k++)
            next[i] += t->K[k * n + i / n] * (ld)p->r[k] * t->K[k * n + i % n];
}

/* The slow twin: X <- what is in front of it, until it stays. */
static int iterate(const problem *p, twin *t)
{
    static ld next[MAXN * MAXN];
    const int n = p->n;
    int k, i, j, settled = 0;
    for (k = 0; k < 20000; k++) {
        ld change = 0, top = 0;
        back(p, t, next);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                const ld x = (next[i * n + j] + next[j * n + i]) / 2, d = fabsl(x - t->X[i * n + j]);
                change = d > change ? d : change;
                top = fabsl(x) > top ? fabsl(x) : top;
            }
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                t->X[i * n + j] = (next[i * n + j] + next[j * n + i]) / 2;
        if (change <= 2e-15L * top && ++settled > 400) break;
    }
    back(p, t, next);
    return k < 20000;
}

static ld top_of(int n, const ld *x)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl(x[i]) > top ? fabsl(x[i]) : top;
    return top;
}

static roln_status solve(problem *p)
{
    const roln_status st = roln_dare(p->n, p->m, p->A, p->B, p->D, p->r, p->C, p->K, room_of(ROLN_DARE_WORK(p->n, p->m)));
    CHECK_BELOW(room_used(), room_end);
    return st;
}

/* Is every power of A - B K small in the end? */
static int is_stable(const problem *p, const twin *t)
{
    static ld K[MAXM * MAXN], F[MAXN * MAXN], G[MAXN * MAXN];
    const int n = p->n;
    int i, k;
    widen(p->m * n, p->K, K);
    times(n, p->m, n, 0, t->B, K, F);
    for (i = 0; i < n * n; i++)
        F[i] = t->A[i] - F[i];
    for (k = 0; k < 40 && top_of(n * n, F) < 1e6L; k++) {
        t_mul(n, F, F, G);
        memcpy(F, G, sizeof F);
    }
    return top_of(n * n, F) < 1e-6L;
}

/* roln_dare and its twin; bound in eps, of X and of S (K - K_twin), S^T S = R + B^T X B, which is what an error of K costs. */
static void check_problem(const char *what, problem *p, ld bound)
{
    static twin t;
    static ld C[MAXN * MAXN], X[MAXN * MAXN], K[MAXM * MAXN], rest[MAXN * MAXM], dK[MAXM * MAXN], BdK[MAXN * MAXM], CA[MAXN * MAXN];
    const int n = p->n, m = p->m;
    ld worst, cost, wild;
    int i, j;
    widen_all(p, &t);
    if (!CHECK(solve(p) == ROLN_OK) || !CHECK(iterate(p, &t))) {
        printf("    %s, n %d, m %d\n", what, n, m);
        return;
    }
    CHECK_BELOW(room_end - 2, room_used());
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            CHECK(p->C[i * n + j] >= 0 && p->C[i * n + j] <= 0); /* upper triangular */
    widen(n * n, p->C, C), widen(m * n, p->K, K);
    times(n, n, n, 1, C, C, X);
    for (worst = 0, i = 0; i < n * n; i++)
        worst = fabsl(X[i] - t.X[i]) > worst ? fabsl(X[i] - t.X[i]) : worst;
    wild = 1 + top_of(n * n, t.A); /* C in front of a step is what is left of C A */
    BOUND(what, worst / top_of(n * n, t.X) / wild / EPS, bound);
    for (i = 0; i < m * n; i++)
        dK[i] = K[i] - t.K[i];
    times(n, m, n, 0, t.B, dK, rest);
    times(n, n, n, 0, C, rest, BdK);
    cost = top_of(n * n, BdK);
    for (i = 0; i < m * n; i++)
        cost = fabsl(dK[i]) * sqrtl((ld)p->r[i / n]) > cost ? fabsl(dK[i]) * sqrtl((ld)p->r[i / n]) : cost;
    times(n, n, n, 0, C, t.A, CA);
    times(n, n, m, 0, C, t.B, rest);
    cost /= top_of(n * n, CA) + top_of(n * m, rest) * top_of(m * n, t.K);
    BOUND("  cost of an error of K", cost / EPS, bound);
    memcpy(t.X, X, sizeof t.X); /* the equation, of X as it came out */
    back(p, &t, rest);
    for (worst = 0, i = 0; i < n * n; i++)
        worst = fabsl(rest[i] - X[i]) > worst ? fabsl(rest[i] - X[i]) : worst;
    BOUND("  residual of the equation", worst / top_of(n * n, X) / wild / EPS, bound);
    CHECK(is_stable(p, &t));
}

static void test_dare(void)
{
    static problem p;
    uint64_t s = 1;
    int n, k;
    for (n = 1; n <= MAXN; n++)
        for (k = 0; k < 4; k++) {
            const int m = k == 0 ? 1 : k == 1 ? (n + 1) / 2 : k == 2 ? n : n + 2;
            draw(n, m, 0.9, 1, &s, &p);
            check_problem("Riccati", &p, 30);
            draw(n, m, 0.9, 1e-6, &s, &p);
            if (m <= n) check_problem("Riccati, inputs for nothing", &p, 60);
            draw(n, m, 0.7, 1e8, &s, &p);
            check_problem("Riccati, dear inputs", &p, 30);
            draw(n, n, 30, 1, &s, &p); /* a large time step: every mode grows by tens */
            check_problem("Riccati, very unstable", &p, 40);
            draw(n, 1, 2, 1, &s, &p);
            if (n <= 10) check_problem("Riccati, unstable, one input", &p, 60); /* without the steps at the end: 100 */
            draw(n, m, 1.2, 1e4, &s, &p);
            if (n <= 4) check_problem("Riccati, unstable, dear inputs", &p, 30);
        }
}

/* n = m = 1: b^2 x^2 + (r - a^2 r - q b^2) x - q r = 0 */
static void test_scalar(void)
{
    static const double as[] = {0, 0.5, -0.99, 1, 1.01, -3, 1e3}, qs[] = {1e-6, 1, 1e6}, rs[] = {1e-10, 1, 1e10};
    static problem p;
    int i, j, k;
    p.n = p.m = 1;
    p.B[0] = ROLN_C(0.75);
    for (i = 0; i < 7; i++)
        for (j = 0; j < 3; j++)
            for (k = 0; k < 3; k++) {
                ld a, b, q, r, h, x, K, slow;
                p.A[0] = (roln_real)as[i], p.D[0] = ROLN_SQRT((roln_real)qs[j]), p.r[0] = (roln_real)rs[k];
                a = (ld)p.A[0], b = (ld)p.B[0], q = (ld)p.D[0] * (ld)p.D[0], r = (ld)p.r[0];
                h = (r - a * a * r - q * b * b) / 2;
                x = h < 0 ? (-h + sqrtl(h * h + b * b * q * r)) / (b * b) : q * r / (h + sqrtl(h * h + b * b * q * r));
                K = a * b * x / (r + b * b * x);
                slow = 1 / (1 - (a - b * K) * (a - b * K)); /* how much an error of a becomes of x */
                if (slow * EPS > 1e-3L) continue;
                if (!CHECK(solve(&p) == ROLN_OK)) continue;
                BOUND("scalar X", fabsl((ld)p.C[0] * (ld)p.C[0] / x - 1) / slow / (1 + fabsl(a)) / EPS, 10);
                BOUND("scalar K", fabsl((ld)p.K[0] - K) / (fabsl(K) * slow + 1e-30L) / EPS, 10);
            }
}

/* p must fail with this status, and leave C and K as they were. */
static void refuse(problem *p, roln_status want)
{
    int i, kept = 1;
    for (i = 0; i < MAXN * MAXN; i++)
        p->C[i] = 7;
    for (i = 0; i < MAXM * MAXN; i++)
        p->K[i] = 7;
    CHECK(solve(p) == want);
    for (i = 0; i < MAXN * MAXN; i++)
        kept &= p->C[i] <= 7 && p->C[i] >= 7;
    for (i = 0; i < MAXM * MAXN; i++)
        kept &= p->K[i] <= 7 && p->K[i] >= 7;
    CHECK(kept);
}

static void test_refused(void)
{
    static const double out_of_reach[] = {1, -1, 1.25, 40};
    static problem p;
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    uint64_t s = 2;
    int i, k;
    for (i = 0; i < 4; i++) { /* a mode that nothing moves and something else sees; then one that is moved, and unseen */
        draw(3, 2, 0.9, 1, &s, &p);
        p.A[6] = p.A[7] = p.B[4] = p.B[5] = 0, p.A[8] = (roln_real)out_of_reach[i];
        refuse(&p, ROLN_E_NO_CONVERGENCE);
        draw(3, 2, 0.9, 1, &s, &p);
        p.A[2] = p.A[5] = p.D[2] = p.D[5] = p.D[8] = 0, p.A[8] = (roln_real)out_of_reach[i];
        refuse(&p, ROLN_E_NO_CONVERGENCE);
    }
    draw(3, 2, 0.9, 1, &s, &p); /* the same, but it dies by itself */
    p.A[6] = p.A[7] = p.B[4] = p.B[5] = 0, p.A[8] = ROLN_C(0.5);
    check_problem("Riccati, stabilisable", &p, 30);
    for (i = 0; i < 9; i++)
        p.D[i] = 0, p.A[i] /= 4;
    CHECK(solve(&p) == ROLN_OK && p.K[0] >= 0 && p.K[0] <= 0); /* costs nothing, stable: nothing to do */
    for (k = 0; k < 3; k++)
        for (i = 0; i < 4; i++) {
            draw(3, 2, 0.9, 1, &s, &p);
            *(i == 0 ? p.A + 4 : i == 1 ? p.B + 5 : i == 2 ? p.D + 8 : p.r + 1) = bad[k];
            refuse(&p, ROLN_E_NOT_FINITE);
            if (i == 3) CHECK(roln_riccati(3, 2, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(3, 2))) != ROLN_OK);
        }
    for (k = 0; k < 2; k++) {
        draw(3, 2, 0.9, 1, &s, &p);
        p.r[k] = -(roln_real)k;
        refuse(&p, ROLN_E_NOT_SPD);
        CHECK(roln_riccati(3, 2, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(3, 2))) == ROLN_E_NOT_SPD);
    }
    draw(3, 2, 0.9, 1, &s, &p);
    p.A[4] = (roln_real)NAN;
    for (i = 0; i < 9; i++)
        p.C[i] = 1;
    CHECK(roln_riccati(3, 2, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(3, 2))) == ROLN_E_NOT_FINITE &&
          p.C[8] >= 1 && p.C[8] <= 1);
}

/* R^T R = X^T X, zeros below; columns of any size. */
static void test_triangle(void)
{
    static roln_real X[24 * 8], R[24 * 8];
    uint64_t s = 3;
    int rows, n, i, j, k;
    for (n = 1; n <= 8; n++)
        for (rows = n; rows <= 24; rows += 5) {
            for (i = 0; i < rows * n; i++)
                R[i] = X[i] = roln_normal(&s) * (i % n == 1 ? ROLN_C(1e-25) : i % n == 2 ? ROLN_C(1e25) : 1) * (i % n != 3);
            roln_triangle(rows, n, R, room_of(ROLN_TRIANGLE_WORK(rows, n)));
            CHECK_ROOM();
            for (i = 0; i < n; i++)
                for (j = 0; j < n; j++) {
                    ld a = 0, b = 0, ai = 0, aj = 0;
                    for (k = 0; k < rows; k++) {
                        a += (ld)X[k * n + i] * (ld)X[k * n + j];
                        ai += (ld)X[k * n + i] * (ld)X[k * n + i], aj += (ld)X[k * n + j] * (ld)X[k * n + j];
                        b += (ld)R[k * n + i] * (ld)R[k * n + j];
                    }
                    BOUND("triangle", fabsl(a - b) / (sqrtl(ai * aj) + 1e-60L) / EPS, 20);
                }
            for (i = 0; i < rows; i++)
                for (j = 0; j < n && j < i; j++)
                    CHECK(R[i * n + j] >= 0 && R[i * n + j] <= 0);
        }
    X[0] = (roln_real)NAN;
    roln_triangle(4, 2, X, room_of(ROLN_TRIANGLE_WORK(4, 2)));
    CHECK(!roln_all_finite(4, X));
}

/* A system that changes from step to step, x+ = A_k x + B_k u, with a cost of its own at the end. */
typedef struct {
    problem step[STEPS];
    roln_real end[MAXN * MAXN];
} course;

/* The inputs u [STEPS][m] of least cost from x: the normal equations of all of them at once. */
static void all_at_once(const course *c, const ld *x, ld *u)
{
    static ld at[MAXN * (STEPS * 3 + 1)], next[MAXN * (STEPS * 3 + 1)], row[STEPS * 3 + 1], N[TN * TN];
    const int n = c->step[0].n, m = c->step[0].m, P = STEPS * m, W = P + 1;
    int i, j, k, l, step;
    memset(N, 0, sizeof N), memset(at, 0, sizeof at);
    for (i = 0; i < P; i++)
        u[i] = 0, N[i * P + i] = (ld)c->step[i / m].r[i % m];
    for (i = 0; i < n; i++)
        at[i * W + P] = x[i]; /* the state is at [n][P] u + the last column */
    for (step = 0; step <= STEPS; step++) {
        const problem *p = c->step + (step < STEPS ? step : 0);
        const roln_real *D = step < STEPS ? p->D : c->end;
        for (i = 0; i < n; i++) { /* D (at u + ..) weighs */
            for (j = 0; j < W; j++)
                for (row[j] = 0, k = 0; k < n; k++)
                    row[j] += (ld)D[i * n + k] * at[k * W + j];
            for (k = 0; k < P; k++)
                for (u[k] -= row[k] * row[P], l = 0; l < P; l++)
                    N[k * P + l] += row[k] * row[l];
        }
        for (i = 0; i < n && step < STEPS; i++) {
            for (j = 0; j < W; j++)
                for (next[i * W + j] = 0, k = 0; k < n; k++)
                    next[i * W + j] += (ld)p->A[i * n + k] * at[k * W + j];
            for (j = 0; j < m; j++)
                next[i * W + step * m + j] += (ld)p->B[i * m + j];
        }
        memcpy(at, next, sizeof at);
    }
    t_solve(P, 1, N, u);
}

static void test_course(void)
{
    static course c;
    static roln_real K[STEPS][MAXM * MAXN], C[MAXN * MAXN];
    uint64_t s = 4;
    int n, m, i, j, k;
    for (n = 1; n <= 8; n++)
        for (m = 1; m <= 3; m++) {
            ld x[MAXN], y[MAXN], u[STEPS * 3], v, top = 0;
            for (k = 0; k < STEPS; k++)
                draw(n, m, 1.2, 0.5, &s, c.step + k);
            for (i = 0; i < n * n; i++)
                c.end[i] = C[i] = roln_normal(&s);
            for (k = STEPS - 1; k >= 0; k--) {
                const problem *p = c.step + k;
                CHECK(roln_riccati(n, m, p->A, p->B, p->D, p->r, C, K[k], room_of(ROLN_RICCATI_WORK(n, m))) == ROLN_OK);
                CHECK_ROOM();
            }
            for (i = 0; i < n; i++)
                x[i] = (ld)roln_normal(&s);
            all_at_once(&c, x, u);
            for (i = 0; i < STEPS * m; i++)
                top = fabsl(u[i]) > top ? fabsl(u[i]) : top;
            for (k = 0; k < STEPS; k++) { /* u = -K x along the way, and the way that it leads */
                const problem *p = c.step + k;
                for (i = 0; i < n; i++)
                    for (y[i] = 0, j = 0; j < n; j++)
                        y[i] += (ld)p->A[i * n + j] * x[j];
                for (i = 0; i < m; i++) {
                    for (v = 0, j = 0; j < n; j++)
                        v -= (ld)K[k][i * n + j] * x[j];
                    BOUND("gains along a course", fabsl(v - u[k * m + i]) / top / EPS, 20);
                    for (j = 0; j < n; j++)
                        y[j] += (ld)p->B[j * m + i] * v;
                }
                memcpy(x, y, sizeof x);
            }
        }
}

void TEST_NAME(riccati)(void)
{
    test_triangle();
    test_dare();
    test_scalar();
    test_refused();
    test_course();
    print_bounds();
}
