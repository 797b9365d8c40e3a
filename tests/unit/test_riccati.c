/* SPDX-License-Identifier: MIT */
/* Riccati equations, roln.h section 3: triangles; roln_dare against the plain fixed-point iteration in long double, the
   equation itself and closed forms; what cannot be stabilised; roln_riccati along a time-varying system against one dense least
   squares problem over all of its steps; rows and units of any size, subsystems that know nothing of each other. */
#include "roln.h"
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
            if (n <= 10) check_problem("Riccati, unstable, one input", &p, 60);
            draw(n, m, 1.2, 1e4, &s, &p);
            if (n <= 4) check_problem("Riccati, unstable, dear inputs", &p, 30);
        }
}

/* The weight of a state that hardly acts on the rest: without it the loop of a fast, unstable mode has a slow one beside it, which
   steps of the recursion hardly move. The distance of K from its twin, in what an error of eps of A, B, D makes. */
static void check_slow(const char *what, problem *p, ld bound)
{
    static problem near;
    static twin t, other;
    uint64_t s = 3;
    ld wide = 0, off = 0;
    int k, i;
    widen_all(p, &t);
    if (!CHECK(iterate(p, &t)) || !CHECK(solve(p) == ROLN_OK)) return;
    for (k = 0; k < 8; k++) {
        near = *p;
        widen_all(&near, &other);
        for (i = 0; i < p->n * p->n; i++)
            other.A[i] *= 1 + EPS * ((ld)roln_uniform(&s) - 0.5L), other.Q[i] *= 1 + EPS * ((ld)roln_uniform(&s) - 0.5L);
        for (i = 0; i < p->n * p->m; i++)
            other.B[i] *= 1 + EPS * ((ld)roln_uniform(&s) - 0.5L);
        memcpy(other.X, t.X, sizeof t.X);
        CHECK(iterate(&near, &other));
        for (i = 0; i < p->m * p->n; i++)
            wide = fabsl(other.K[i] / t.K[i] - 1) > wide ? fabsl(other.K[i] / t.K[i] - 1) : wide;
    }
    for (i = 0; i < p->m * p->n; i++)
        off = fabsl((ld)p->K[i] / t.K[i] - 1) > off ? fabsl((ld)p->K[i] / t.K[i] - 1) : off;
    BOUND(what, off / (wide + EPS), bound);
}

static void test_slow(void)
{
    static const problem found = {.n = 2, .m = 1, .r = {ROLN_C(107.824677)},
                                  .A = {ROLN_C(1.06507134), ROLN_C(.00322372373), ROLN_C(.0677076206), ROLN_C(3.75137115)},
                                  .B = {ROLN_C(.00745443907), ROLN_C(.0030851271)}, .D = {ROLN_C(.328994691)}};
    static problem p;
    uint64_t s = 12;
    int k;
    p = found;
    check_slow("a slow mode beside an unstable one", &p, 40);
    for (k = 0; k < 30; k++) { /* a cart whose pole falls by this factor in a step, and hardly a weight of its place */
        const double fall = 1.03 + 0.1 * k * (double)roln_uniform(&s), place = pow(10, -1 - k % 2), h = 0.05;
        const double w = log(fall) / h, c = cosh(w * h), d = sinh(w * h) / w;
        const double A[16] = {1, 0, h, 0, 0, c, 0, d, 0, 0, 1, 0, 0, w * w * d, 0, c}, B[4] = {h * h / 2, (1 - c) / (w * w), h, -d};
        int i;
        memset(&p, 0, sizeof p);
        p.n = 4, p.m = 1, p.r[0] = ROLN_C(0.01);
        for (i = 0; i < 16; i++) p.A[i] = (roln_real)A[i];
        for (i = 0; i < 4; i++) p.B[i] = (roln_real)B[i];
        p.D[0] = (roln_real)place, p.D[5] = 1;
        check_slow("a cart and its pole", &p, 200);
    }
}

/* Slow loops in which policies are less than doubling. As float: policies that come to rest though steps of the recursion do not;
   policies that wander by less than a tenth, where K is that of the doubling; by more, where there is no answer. */
static void test_wander(void)
{
    static const problem cases[] = {
        {.n = 3, .m = 2,
         .A = {ROLN_C(-0.857216358), ROLN_C(-0.861150801), ROLN_C(0.552766263), ROLN_C(0.328560114), ROLN_C(1.31071568),
               ROLN_C(0.242807537), ROLN_C(0.793439925), ROLN_C(0.813782573), ROLN_C(-0.308799297)},
         .B = {ROLN_C(-0.000351710944), ROLN_C(-0.000209315767), ROLN_C(0.000210466009), ROLN_C(0.000154881185),
               ROLN_C(-0.000132968911), ROLN_C(-0.000151336382)},
         .D = {0, ROLN_C(-6.90635497e-05), 0, ROLN_C(-8.69130963e-05), ROLN_C(0.000130102271), ROLN_C(-9.83860955e-05),
               0, 0, 0},
         .r = {ROLN_C(1.19843364), ROLN_C(0.0128727369)}},
        {.n = 3, .m = 1,
         .A = {ROLN_C(2.42406583), ROLN_C(-0.478119493), ROLN_C(-1.63476133), ROLN_C(0.542208672), ROLN_C(1.58960879),
               ROLN_C(-1.40279174), ROLN_C(-1.52058911), ROLN_C(0.299017549), ROLN_C(-0.0966692641)},
         .B = {ROLN_C(0.0392423384), ROLN_C(0.126370415), ROLN_C(-0.299140602)},
         .D = {0, ROLN_C(0.00102705462), ROLN_C(-0.000214485117), ROLN_C(9.70622496e-05), ROLN_C(1.59688545e-06), 0,
               ROLN_C(-0.00120244513), ROLN_C(0.000856818573), 0},
         .r = {ROLN_C(0.500014067)}},
        {.n = 3, .m = 1,
         .A = {ROLN_C(0.951800227), ROLN_C(-0.027492078), ROLN_C(-0.0548694171), ROLN_C(0.0148172146),
               ROLN_C(1.12245715), ROLN_C(-0.063704364), ROLN_C(0.0837301761), ROLN_C(0.0106176762), ROLN_C(1.15451884)},
         .B = {ROLN_C(-0.306530714), ROLN_C(0.208105296), ROLN_C(0.13905555)},
         .D = {ROLN_C(-0.000436053408), ROLN_C(-0.00024040704), ROLN_C(-0.00011340902), ROLN_C(-0.000190262203),
               ROLN_C(-0.000191822153), 0, 0, ROLN_C(0.000306854286), 0},
         .r = {ROLN_C(0.726760507)}},
    };
    int i, k;
    for (k = 0; k < 3; k++) {
        static problem p;
        static twin t;
        ld off = 0, top = 0;
        p = cases[k];
        widen_all(&p, &t);
        if (!CHECK(iterate(&p, &t)) || !CHECK(solve(&p) == PICK(k == 2 ? ROLN_E_NO_CONVERGENCE : ROLN_OK, ROLN_OK))) continue;
        for (i = 0; i < p.n * p.m; i++)
            off = ROLN_MAX(off, fabsl((ld)p.K[i] - t.K[i])),
            top = ROLN_MAX(top, fabsl(t.K[i]));
        if (k < PICK(2, 3)) BOUND("policies that wander", off / top, PICK(1e-4L, 1e-9L));
    }
}

/* The parts of the search for a policy where nothing converges: a loop that K leaves on its edge, one that grows; motions of K. */
static void test_no_policy(void)
{
    static const roln_real zero = 0, one = 1, two = 2, little = ROLN_C(0.1), nan = (roln_real)NAN, most = ROLN_C(1.5);
    roln_real C, K, steps, first, work[64];
    CHECK(rolni_policy(1, 1, &one, &one, &one, &one, &zero, &C, &steps, work) == ROLN_E_NO_CONVERGENCE);
    CHECK(rolni_policy(1, 1, &two, &one, &one, &one, &zero, &C, &steps, work) == ROLN_E_NO_CONVERGENCE);
    C = 1;
    CHECK(rolni_riccatis(2, 1, 1, &nan, &one, &one, &one, &C, &K, work) != ROLN_OK);
    C = 1, K = 1;
    CHECK(!rolni_policies(1, 1, &nan, &one, &one, &one, &C, &K, &first, work));
    C = 0, K = 0; /* the first policy leaves the loop unstable */
    CHECK(rolni_riccatis(3, 1, 1, &most, &little, &little, &one, &C, &K, work) == ROLN_OK);
    C = 0, K /= 2;
    CHECK(!rolni_policies(1, 1, &most, &little, &little, &one, &C, &K, &first, work) && first > ROLN_C(0.4));
    C = 1;
    CHECK(rolni_moved(1, 1, &one, &C, &one, &two, work) <= 1 && rolni_moved(1, 1, &one, &C, &little, &two, work) >= 1);
    CHECK(rolni_moved(1, 1, &one, &C, &nan, &one, work) >= 1);
}

/* A state that costs nothing itself but through another one: a pivot of C is 0 in the first steps. In two units of the other. */
static void test_late_cost(void)
{
    static problem p;
    static twin t;
    int k, unit;
    for (k = 0; k < 10; k++)
        for (unit = 0; unit < 2; unit++) {
            const roln_real of = unit ? ROLN_C(1024.0) : 1;
            memset(&p, 0, sizeof p);
            p.n = 2, p.m = 1, p.A[1] = ROLN_C(0.2) * of, p.A[3] = ROLN_C(0.3) + ROLN_C(0.02) * (roln_real)k;
            p.B[1] = 1, p.D[0] = 1 / of, p.r[0] = 1;
            if (!CHECK(solve(&p) == ROLN_OK)) continue;
            widen_all(&p, &t);
            CHECK(iterate(&p, &t));
            BOUND("a state whose cost comes later", fabsl((ld)p.K[1] / t.K[1] - 1) / EPS, 10);
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
            roln_qr_r(rows, n, R, room_of(ROLN_QR_R_WORK(rows, n)));
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
    for (i = 0; i < 8; i++) { /* in any place, above and below zeros, too */
        memset(R, 0, sizeof R);
        R[i] = (roln_real)NAN;
        roln_qr_r(4, 2, R, room_of(ROLN_QR_R_WORK(4, 2)));
        CHECK(!roln_all_finite(4, R));
    }
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

/* Triangle of X [rows][n] for rows of any size: Householder with the largest column first and its largest row on top, which loses
   nothing of light rows (Cox and Higham 1998). Only the first `free` columns change places, as order [n] says. */
static void t_triangle(int rows, int n, int free, ld *X, int *order)
{
    int i, j, k, at, heavy;
    for (k = 0; k < n && k < rows; k++) {
        ld best = -1, s = 0, w;
        for (at = j = k; j < (k < free ? free : n) && (k < free || j == k); j++) {
            for (s = 0, i = k; i < rows; i++)
                s += X[i * n + j] * X[i * n + j];
            if (s > best) best = s, at = j;
        }
        for (i = 0; i < rows; i++)
            w = X[i * n + k], X[i * n + k] = X[i * n + at], X[i * n + at] = w;
        i = order[k], order[k] = order[at], order[at] = i;
        for (heavy = i = k; i < rows; i++)
            if (fabsl(X[i * n + k]) > fabsl(X[heavy * n + k])) heavy = i;
        for (j = 0; j < n; j++)
            w = X[k * n + j], X[k * n + j] = X[heavy * n + j], X[heavy * n + j] = w;
        if (!(best > 0)) continue;
        s = X[k * n + k] > 0 ? -sqrtl(best) : sqrtl(best);
        X[k * n + k] -= s;
        for (j = k + 1; j < n; j++) {
            for (w = 0, i = k; i < rows; i++)
                w += X[i * n + k] * X[i * n + j];
            w /= s * X[k * n + k];
            for (i = k; i < rows; i++)
                X[i * n + j] += X[i * n + k] * w;
        }
        for (X[k * n + k] = s, i = k + 1; i < rows; i++)
            X[i * n + k] = 0;
    }
}

/* x, but for a random part of it up to `off`. */
static ld moved(ld x, ld off, uint64_t *s)
{
    return off > 0 ? x * (1 + off * (ld)(2 * roln_uniform(s) - 1)) : x;
}

/* A step of roln_riccati in long double, inputs in units of their weights: K [m][n] out, C [n][n] in and out. Every number of A, B,
   C, D, C B and C A is moved by `off`. */
static void t_riccati(const problem *p, ld off, uint64_t *s, ld *C, ld *K)
{
    static ld A[MAXN * MAXN], B[MAXN * MAXM], X[(MAXM + 2 * MAXN) * (MAXM + MAXN)], T[MAXN * (MAXM + MAXN)];
    const int n = p->n, m = p->m, side = n + m;
    int order[MAXM + MAXN], i, j, k;
    memset(X, 0, sizeof X);
    for (i = 0; i < n * n; i++)
        A[i] = moved((ld)p->A[i], off, s), C[i] = moved(C[i], off, s);
    for (i = 0; i < n * m; i++)
        B[i] = moved((ld)p->B[i], off, s);
    for (i = 0; i < side; i++)
        order[i] = i;
    for (i = 0; i < m; i++)
        X[i * side + i] = 1;
    for (i = 0; i < n; i++)
        for (k = 0; k < n; k++) {
            for (j = 0; j < m; j++)
                X[(m + i) * side + j] += C[i * n + k] * B[k * m + j] / sqrtl((ld)p->r[j]);
            for (j = 0; j < n; j++)
                X[(m + i) * side + m + j] += C[i * n + k] * A[k * n + j];
            X[(m + n + i) * side + m + k] = moved((ld)p->D[i * n + k], off, s);
        }
    for (i = m * side; i < (m + n) * side; i++)
        X[i] = moved(X[i], off, s);
    t_triangle(m + 2 * n, side, m, X, order);
    for (i = m - 1; i >= 0; i--)
        for (j = 0; j < n; j++) {
            ld x = X[i * side + m + j];
            for (k = i + 1; k < m; k++)
                x -= X[i * side + k] * T[k * n + j];
            T[i * n + j] = x / X[i * side + i];
        }
    for (i = 0; i < m; i++)
        for (j = 0; j < n; j++)
            K[order[i] * n + j] = T[i * n + j] / sqrtl((ld)p->r[order[i]]);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            C[i * n + j] = X[(m + i) * side + m + j];
}

/* The largest of |K - L| in row j of [m][n], and of |K|. */
static ld apart(int n, int j, const ld *K, const ld *L)
{
    ld top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = fabsl(K[j * n + i] - L[j * n + i]) > top ? fabsl(K[j * n + i] - L[j * n + i]) : top;
    return top;
}

/* Weights r of any size beside X, 10^-18 to 10^18 as float and 10^-30 to 10^30 as double, each its own or all alike, with a cost of
   the state or none: each row of K, three steps back, is right to what moves by eps of the numbers in it do. */
static void test_rows(void)
{
    enum { BACK = 3, MANY = 1500, MOVES = 8 };
    static problem p;
    static ld C[MAXN * MAXN], start[MAXN * MAXN], want[BACK][MAXM * MAXN], got[MAXM * MAXN], other[MAXM * MAXN], none[MAXM * MAXN];
    ld wide[BACK][3];
    uint64_t s = 5;
    int kind, i, j, k, c;
    for (c = 0; c < MANY; c++) {
        const int n = 1 + (int)(6 * roln_uniform(&s)), m = 1 + (int)(3 * roln_uniform(&s));
        kind = c % 3;
        draw(n, m, 0.9, 1, &s, &p);
        for (i = 0; i < m; i++)
            p.r[i] = kind == 2 && i > 0 ? p.r[0] : (roln_real)pow(10, PICK(36, 60) * ((double)roln_uniform(&s) - 0.5));
        for (i = 0; i < n * n; i++)
            p.D[i] *= kind != 1, p.C[i] = i % n < i / n ? 0 : roln_normal(&s);
        widen(n * n, p.C, start);
        memcpy(C, start, sizeof C);
        for (k = 0; k < BACK; k++)
            t_riccati(&p, 0, &s, C, want[k]);
        memset(wide, 0, sizeof wide);
        for (i = 0; i < MOVES; i++)
            for (memcpy(C, start, sizeof C), k = 0; k < BACK; k++)
                for (t_riccati(&p, EPS, &s, C, other), j = 0; j < m; j++) {
                    const ld x = apart(n, j, other, want[k]);
                    wide[k][j] = x > wide[k][j] ? x : wide[k][j];
                }
        for (k = 0; k < BACK; k++) {
            CHECK(roln_riccati(n, m, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(n, m))) == ROLN_OK);
            CHECK_ROOM();
            for (widen(m * n, p.K, got), j = 0; j < m; j++) {
                const ld size = apart(n, j, want[k], none);
                if (wide[k][j] < size / 100) /* else it has no digits */
                    BOUND(kind == 1 ? "rows of any size, no cost of states" : "rows of any size",
                          apart(n, j, got, want[k]) / (wide[k][j] + EPS * size), kind == 1 ? 10 : 40);
            }
        }
    }
    for (c = 1; c < PICK(18, 100); c++) { /* X1 = r X / (r + X), K2 = X1 / (r + X1) = 1/2 for r far below X */
        p.A[0] = p.B[0] = 1, p.D[0] = 0, p.C[0] = 10000, p.r[0] = (roln_real)pow(10, -c);
        for (i = 0; i < 2; i++)
            CHECK(roln_riccati(1, 1, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(1, 1))) == ROLN_OK);
        BOUND("light input", fabsl((ld)p.K[0] - 1 / (2 + (ld)p.r[0] * 1e-8L)) / EPS, 3);
    }
}

/* p with states in units of t [n], inputs in units of u [m]. */
static void in_units(const problem *p, const roln_real *t, const roln_real *u, problem *to)
{
    const int n = p->n, m = p->m;
    int i, j;
    *to = *p;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++)
            to->A[i * n + j] *= t[j] / t[i], to->D[i * n + j] *= t[j], to->C[i * n + j] *= t[j];
        for (j = 0; j < m; j++)
            to->B[i * m + j] *= u[j] / t[i];
    }
    for (j = 0; j < m; j++)
        to->r[j] *= u[j] * u[j];
}

/* K of `of`, in other units, against that of p: parts of what moves of A, B by eps do to each row of it. */
static void check_units(const char *what, const problem *p, const roln_real *t, const roln_real *u, const problem *of, ld bound)
{
    static problem other;
    static ld K[MAXM * MAXN], L[MAXM * MAXN], M[MAXM * MAXN], none[MAXM * MAXN];
    const int n = p->n, m = p->m;
    ld wide[3] = {0, 0, 0};
    uint64_t s = 9;
    int i, j, k;
    for (i = 0; i < m * n; i++)
        K[i] = (ld)p->K[i], L[i] = (ld)of->K[i] * (ld)u[i / n] / (ld)t[i % n];
    for (k = 0; k < 6; k++) {
        other = *p;
        for (i = 0; i < n * n; i++)
            other.A[i] *= 1 + (roln_uniform(&s) < ROLN_C(0.5) ? ROLN_EPS : -ROLN_EPS);
        for (i = 0; i < n * m; i++)
            other.B[i] *= 1 + (roln_uniform(&s) < ROLN_C(0.5) ? ROLN_EPS : -ROLN_EPS);
        if (solve(&other) != ROLN_OK) return; /* it has no digits */
        widen(m * n, other.K, M);
        for (j = 0; j < m; j++)
            wide[j] = apart(n, j, K, M) > wide[j] ? apart(n, j, K, M) : wide[j];
    }
    for (j = 0; j < m; j++)
        BOUND(what, apart(n, j, K, L) / (wide[j] + EPS * apart(n, j, K, none)), bound);
}

/* Units of states and inputs over six decades: of powers of two roln_riccati gives the same bits, roln_dare and powers of ten
   rounding errors. */
static void test_state_units(void)
{
    static problem p, q;
    uint64_t s = 6;
    int c, i, j;
    for (c = 0; c < 600; c++) {
        const int n = 1 + (int)(6 * roln_uniform(&s)), m = 1 + (int)(3 * roln_uniform(&s)), two = c % 2;
        roln_real t[MAXN + 3], *const u = t + n;
        draw(n, m, c % 3 ? 0.9 : 1.2, c % 3 ? 1 : 100, &s, &p);
        for (i = 0; i < n + m; i++)
            t[i] = (roln_real)(two ? ldexp(1, (int)(20 * roln_uniform(&s)) - 10) : pow(10, 6 * (double)roln_uniform(&s) - 3));
        for (i = 0; i < n * n; i++)
            p.C[i] = roln_normal(&s);
        in_units(&p, t, u, &q);
        if (two) {
            CHECK(roln_riccati(n, m, p.A, p.B, p.D, p.r, p.C, p.K, room_of(ROLN_RICCATI_WORK(n, m))) == ROLN_OK);
            CHECK(roln_riccati(n, m, q.A, q.B, q.D, q.r, q.C, q.K, room_of(ROLN_RICCATI_WORK(n, m))) == ROLN_OK);
            for (i = 0; i < n; i++) {
                for (j = 0; j < m; j++)
                    CHECK((ld)p.K[j * n + i] * (ld)(t[i] / u[j]) - (ld)q.K[j * n + i] == 0);
                for (j = 0; j < n; j++)
                    CHECK((ld)p.C[j * n + i] * (ld)t[i] - (ld)q.C[j * n + i] == 0);
            }
        }
        if (solve(&p) != ROLN_OK) continue; /* an unstable mode that an input hardly moves */
        if (CHECK(solve(&q) == ROLN_OK)) check_units(two ? "units of two" : "units of ten", &p, t, u, &q, 5);
    }
}

/* Subsystems that know nothing of each other, with costs 1e-8 to 1e8 apart and from fast to very slow: each as if it were alone. */
static void test_decoupled(void)
{
    static problem all, part[3];
    uint64_t s = 7;
    int c, b, i, j;
    for (c = 0; c < 1500; c++) {
        const int parts = 1 + (int)(3 * roln_uniform(&s));
        int n = 0, m = parts, ok = 1;
        memset(&all, 0, sizeof all);
        for (b = 0; b < parts; b++)
            n += part[b].n = 1 + (int)(2 * roln_uniform(&s));
        all.n = n, all.m = m;
        for (n = 0, b = 0; b < parts; n += part[b++].n) {
            problem *const p = part + b;
            const int of = p->n;
            const roln_real cost = (roln_real)pow(10, 8 * (double)roln_uniform(&s) - 4); /* its root */
            p->m = 1;
            for (i = 0; i < of * of; i++)
                p->A[i] = i % (of + 1) == 0, p->D[i] = 0;
            for (i = 0; i < of; i++)
                p->B[i] = i == of - 1, p->D[i * (of + 1)] = (roln_real)pow(10, -3 * (double)roln_uniform(&s));
            if (of == 1) p->A[0] = c % 4 ? 1 + ROLN_C(0.002) * (roln_uniform(&s) - ROLN_C(0.5)) : roln_uniform(&s);
            else p->A[1] = (roln_real)pow(10, -2 * (double)roln_uniform(&s)); /* a double integrator */
            p->r[0] = 1;
            ok &= solve(p) == ROLN_OK;
            for (i = 0; i < of; i++) {
                for (j = 0; j < of; j++)
                    all.A[(n + i) * all.n + n + j] = p->A[i * of + j], all.D[(n + i) * all.n + n + j] = cost * p->D[i * of + j];
                all.B[(n + i) * m + b] = p->B[i];
            }
            all.r[b] = cost * cost;
        }
        if (!CHECK(ok && solve(&all) == ROLN_OK)) continue;
        for (n = 0, b = 0; b < parts; n += part[b++].n) {
            static const roln_real one[2] = {1, 1};
            static problem from;
            from = part[b];
            for (j = 0; j < all.n; j++) {
                const roln_real x = all.K[b * all.n + j];
                if (j >= n && j < n + from.n) from.K[j - n] = x;
                else CHECK(x >= 0 && x <= 0);
            }
            check_units("each as if alone", part + b, one, one, &from, 5);
        }
    }
}

/* Whether K still moves is asked of each row, in any units: of a light row of a cheap motor that moves by 1/100 or 1/10000, and of
   one that is 0 but for rounding errors. */
static void test_moves(void)
{
    static const roln_real far[3] = {ROLN_C(0.01), ROLN_C(0.0001), 0};
    roln_real C[4] = {1, 0, 0, 1}, r[2], K[4], K0[4], size[4];
    int e, i;
    for (e = -4; e <= 4; e++)
        for (i = 0; i < 3; i++) {
            const roln_real unit = (roln_real)pow(10, e);
            C[3] = unit, r[0] = 1, r[1] = unit * unit;
            K[0] = K[3] = K0[0] = ROLN_C(0.5), K0[3] = K[3] * (1 + far[i]);
            K[1] = K[2] = K0[1] = K0[2] = 0;
            CHECK((rolni_moved(2, 2, r, C, K, K0, size) > ROLN_C(1e-3)) == (i == 0));
            K[3] = 4 * ROLN_EPS, K0[3] = -K[3];
            CHECK(rolni_moved(2, 2, r, C, K, K0, size) <= ROLN_C(1e-3));
        }
}

void TEST_NAME(riccati)(void)
{
    test_triangle();
    test_dare();
    test_slow();
    test_wander();
    test_no_policy();
    test_late_cost();
    test_scalar();
    test_refused();
    test_course();
    test_rows();
    test_state_units();
    test_decoupled();
    test_moves();
    print_bounds();
}
