/* SPDX-License-Identifier: MIT */
/* Optimal control under limits, roln.h section 4: without active limits one dense system of equations; two steps against all
   sets of limits that could be active; many steps against projected coordinate descent in long double; what is promised of the gap;
   limits that always hold; other units; limits that are never reached; torques that start at a limit; what iterations leave;
   numbers that make no sense. */
#include "roln.h"
#include "twin.h"
#include "room.h"

void TEST_NAME(ocp)(void);

enum { MAXN = 8, MAXM = 4, MAXH = 20, MAXP = 80, LONG = 60 };

/* A problem and its solution; the same in long double with the states eliminated: cost 1/2 u^T H u + g^T u + a constant. */
typedef struct {
    int n, m, steps, rated, lessened;
    roln_real A[LONG * MAXN * MAXN], B[LONG * MAXN * MAXM], Q[LONG * MAXN * MAXN], q[LONG * MAXN];
    roln_real r[MAXM], ref[MAXM], at[LONG * MAXM], rate[MAXM], last[MAXM], most[MAXM];
    roln_real less[LONG * MAXM];
    roln_real u[LONG * MAXM], x[(LONG + 1) * MAXN], K[LONG * MAXM * MAXN], duality_gap;
    ld H[MAXP * MAXP], g[MAXP];
} problem;

static roln_ocp ocp_of(const problem *p)
{
    roln_ocp o;
    o.n = p->n, o.m = p->m, o.steps = p->steps;
    o.A = p->A, o.B = p->B, o.Q = p->Q, o.q = p->q, o.r = p->r, o.ref = p->ref, o.at = p->at;
    o.rate = p->rated ? p->rate : NULL, o.last = p->last, o.most = p->most, o.less = p->lessened ? p->less : NULL;
    return o;
}

/* Systems near x+ = x + B u; with costs of size `pull` about 1 limits begin to matter. */
static void draw(int n, int m, int steps, int rated, roln_real pull, uint64_t *s, problem *p)
{
    static roln_real W[MAXN * MAXN];
    int i, k;
    p->n = n, p->m = m, p->steps = steps, p->rated = rated, p->lessened = 0;
    for (i = 0; i < steps * n * n; i++)
        p->A[i] = ROLN_C(0.2) * roln_normal(s) + (i % (n * n) % (n + 1) == 0);
    for (i = 0; i < steps * n * m; i++)
        p->B[i] = ROLN_C(0.3) * roln_normal(s);
    for (k = 0; k < steps; k++) {
        for (i = 0; i < n * n; i++)
            W[i] = roln_normal(s) / 2;
        rolni_zero(n * n, p->Q + k * n * n);
        roln_mm_at(n, n, n, W, W, p->Q + k * n * n);
    }
    for (i = 0; i < steps * n; i++)
        p->q[i] = pull * roln_normal(s);
    for (i = 0; i < m; i++) {
        p->r[i] = ROLN_C(0.1) + roln_uniform(s), p->ref[i] = roln_normal(s) / 4;
        p->rate[i] = ROLN_C(0.05) + roln_uniform(s) / 2, p->last[i] = 2 * roln_uniform(s) - 1, p->most[i] = 1;
    }
    for (i = 0; i < steps * m; i++)
        p->at[i] = 2 * roln_uniform(s) - 1;
}

/* Limits of each step: most less up to 0.7 of it. */
static void lessen(uint64_t *s, problem *p)
{
    int i;
    p->lessened = 1;
    for (i = 0; i < p->steps * p->m; i++)
        p->less[i] = ROLN_C(0.7) * roln_uniform(s) * p->most[i % p->m];
}

/* The limit of |u_i|. */
static ld top_of(const problem *p, int i)
{
    const int j = i % p->m;
    const ld last = p->rated ? fabsl((ld)p->last[j]) : 0, fall = fminl(last, (i / p->m + 1) * (ld)p->rate[j] / 4);
    return p->lessened ? fmaxl((ld)p->most[j] - (ld)p->less[i], last - fall / 2) : (ld)p->most[j];
}

/* H, g from the definition: x_k as a function of all u, [n][P] and a last column for what does not depend on them. */
static void condense(problem *p)
{
    static ld at[MAXN * (MAXP + 1)], next[MAXN * (MAXP + 1)], Qx[MAXN * (MAXP + 1)];
    const int n = p->n, m = p->m, P = p->steps * m, W = P + 1;
    int i, j, k, l, c;
    memset(at, 0, sizeof at), memset(p->H, 0, sizeof p->H), memset(p->g, 0, sizeof p->g);
    for (i = 0; i < P; i++) {
        p->H[i * P + i] = (ld)p->r[i % m];
        p->g[i] = -(ld)p->r[i % m] * (ld)p->ref[i % m];
    }
    for (k = 0; k < p->steps; k++) {
        for (i = 0; i < n; i++) {
            for (c = 0; c < W; c++)
                for (next[i * W + c] = 0, l = 0; l < n; l++)
                    next[i * W + c] += (ld)p->A[(k * n + i) * n + l] * at[l * W + c];
            for (j = 0; j < m; j++) {
                next[i * W + k * m + j] += (ld)p->B[(k * n + i) * m + j];
                next[i * W + P] -= (ld)p->B[(k * n + i) * m + j] * (ld)p->at[k * m + j];
            }
        }
        memcpy(at, next, sizeof at);
        for (i = 0; i < n; i++)
            for (c = 0; c < W; c++)
                for (Qx[i * W + c] = 0, l = 0; l < n; l++)
                    Qx[i * W + c] += (ld)p->Q[(k * n + i) * n + l] * at[l * W + c];
        for (i = 0; i < n; i++)
            for (c = 0; c < P; c++) {
                p->g[c] += at[i * W + c] * (Qx[i * W + P] + (ld)p->q[k * n + i]);
                for (l = 0; l < P; l++)
                    p->H[c * P + l] += at[i * W + c] * Qx[i * W + l];
            }
    }
}

static ld cost_of(const problem *p, const ld *u, ld *gradient)
{
    const int P = p->steps * p->m;
    ld sum = 0;
    int i, j;
    for (i = 0; i < P; i++) {
        ld h = 0;
        for (j = 0; j < P; j++)
            h += p->H[i * P + j] * u[j];
        sum += u[i] * (h / 2 + p->g[i]);
        if (gradient) gradient[i] = h + p->g[i];
    }
    return sum;
}

/* What all numbers of a cost are measured by: its terms without signs. */
static ld size_of(const problem *p, const ld *u)
{
    const int P = p->steps * p->m;
    ld sum = 0;
    int i, j;
    for (i = 0; i < P; i++)
        for (sum += fabsl(u[i] * p->g[i]), j = 0; j < P; j++)
            sum += fabsl(u[i] * p->H[i * P + j] * u[j]) / 2;
    return sum;
}

/* Solves, and asks for what always holds: limits, as real numbers of the machine; scratch to a number. */
static roln_status within(problem *p, int iterations, ld *u)
{
    const roln_ocp o = ocp_of(p);
    const int m = p->m;
    roln_real *const work = room_of(ROLN_OCP_WORK(p->n, m, p->steps, p->rated));
    const roln_status st = roln_ocp_solve(&o, iterations, p->u, p->x, p->K, &p->duality_gap, work);
    int i;
    if (st != ROLN_OK) return st;
    CHECK_ROOM();
    for (i = 0; i < p->steps * m; i++) {
        const roln_real last = i < m ? p->last[i] : p->u[i - m], rate = p->rate[i % m];
        CHECK(fabsl((ld)p->u[i]) <= top_of(p, i) * (1 + (p->lessened ? 4 * EPS : 0)));
        if (p->rated) CHECK(p->u[i] >= last - rate && p->u[i] <= last + rate);
    }
    widen(p->steps * m, p->u, u);
    return ROLN_OK;
}

/* And x is that of u. */
static roln_status solve(problem *p, int iterations, ld *u)
{
    const int n = p->n, m = p->m;
    const roln_status st = within(p, iterations, u);
    int i, j, k;
    for (k = 0; k < p->steps && st == ROLN_OK; k++)
        for (i = 0; i < n; i++) {
            ld x = 0, top = 1;
            for (j = 0; j < n; j++)
                x += (ld)p->A[(k * n + i) * n + j] * (ld)p->x[k * n + j], top += fabsl((ld)p->x[k * n + j]);
            for (j = 0; j < m; j++)
                x += (ld)p->B[(k * n + i) * m + j] * (u[k * m + j] - (ld)p->at[k * m + j]);
            BOUND("x of u", fabsl(x - (ld)p->x[(k + 1) * n + i]) / top / EPS, 100);
        }
    return st;
}

static void transpose(int n, roln_real *A)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++) {
            const roln_real t = A[i * n + j];
            A[i * n + j] = A[j * n + i], A[j * n + i] = t;
        }
}

/* Nothing pulls: no limit matters, and u is the solution of one system of equations, K that of a recursion that knows no limits. */
static void test_free(void)
{
    static problem p;
    static ld u[MAXP], v[MAXP], H[MAXP * MAXP];
    static roln_real C[MAXN * MAXN], D[MAXN * MAXN], K[MAXM * MAXN], work[ROLN_RICCATI_WORK(MAXN, MAXM)];
    uint64_t s = 1;
    int n, m, i, k;
    for (n = 1; n <= MAXN; n++)
        for (m = 1; m <= MAXM; m++) {
            const int steps = 1 + n * m % 7;
            draw(n, m, steps, 0, ROLN_C(0.002), &s, &p);
            for (i = 0; i < steps * m; i++)
                p.at[i] /= 100;
            for (i = 0; i < m; i++)
                p.ref[i] /= 100;
            condense(&p);
            CHECK(solve(&p, 20, u) == ROLN_OK);
            for (i = 0; i < steps * m; i++)
                v[i] = -p.g[i];
            memcpy(H, p.H, sizeof H);
            t_solve(steps * m, 1, H, v);
            for (i = 0; i < steps * m; i++)
                BOUND("free: u", fabsl(u[i] - v[i]), PICK(1e-4L, 1e-11L));
            CHECK(roln_chol(n, p.Q + (steps - 1) * n * n, C) == ROLN_OK);
            for (k = steps - 1; k >= 0; k--) {
                CHECK(k == 0 || roln_chol(n, p.Q + (k - 1) * n * n, D) == ROLN_OK);
                transpose(n, D);
                if (k == steps - 1) transpose(n, C);
                CHECK(roln_riccati(n, m, p.A + k * n * n, p.B + k * n * m, D, p.r, C, K, work) == ROLN_OK);
                for (i = 0; i < m * n; i++)
                    BOUND("free: K", fabsl((ld)K[i] - (ld)p.K[k * m * n + i]), PICK(1e-3L, 1e-9L));
            }
        }
}

/* The least cost with a set of limits taken for equations, if u then is within all of them. code: sides of size, in base 3, 0 none,
   1 lower, 2 upper, and then those of rate. */
static int corner(const problem *p, int code, ld *u, ld *cost)
{
    static ld N[12 * 12], x[12];
    const int m = p->m, P = p->steps * m;
    int i, j, c = P;
    memset(N, 0, sizeof N);
    for (i = 0; i < 2 * P; i++)
        c += (int)(code / pow(3, i)) % 3 != 0;
    if (c > 12 || c > 2 * P) return 0;
    for (i = 0; i < P; i++)
        for (x[i] = -p->g[i], j = 0; j < P; j++)
            N[i * c + j] = p->H[i * P + j];
    for (i = 0, j = P; i < 2 * P; i++) {
        const int side = (int)(code / pow(3, i)) % 3, at = i % P;
        if (side == 0) continue;
        N[j * c + at] = N[at * c + j] = 1;
        x[j] = i < P ? top_of(p, i) : (ld)p->rate[at % m];
        x[j] *= side == 1 ? -1 : 1;
        if (i >= P && at >= m) N[j * c + at - m] = N[(at - m) * c + j] = -1;
        if (i >= P && at < m) x[j] += (ld)p->last[at];
        j++;
    }
    t_solve(c, 1, N, x);
    for (i = 0; i < P; i++) {
        const ld last = i < m ? (ld)p->last[i] : x[i - m], tol = 1e-12L;
        if (!(fabsl(x[i]) <= top_of(p, i) + tol)) return 0; /* NaN of a set that contradicts itself, too */
        if (p->rated && !(fabsl(x[i] - last) <= (ld)p->rate[i % m] + tol)) return 0;
        u[i] = x[i];
    }
    *cost = cost_of(p, u, NULL);
    return 1;
}

/* Limits that are less by nothing: the same bits. */
static void test_less(void)
{
    static problem p, c;
    static ld u[MAXP];
    uint64_t s = 14;
    int trial;
    for (trial = 0; trial < 8; trial++) {
        draw(1 + trial % MAXN, 1 + trial % MAXM, MAXH, trial / 4, 3, &s, &p);
        c = p, c.lessened = 1, memset(c.less, 0, sizeof c.less);
        CHECK(solve(&p, 8, u) == ROLN_OK && solve(&c, 8, u) == ROLN_OK);
        CHECK(memcmp(p.u, c.u, sizeof p.u) == 0 && memcmp(p.K, c.K, sizeof p.K) == 0);
        CHECK(p.duality_gap >= c.duality_gap && p.duality_gap <= c.duality_gap);
    }
}

/* Two steps: the best of all sets of limits. */
static void test_corners(void)
{
    static problem p;
    ld u[MAXP], best[4], v[4], cost;
    uint64_t s = 2, other = 12;
    int trial, active = 0, lower = 0, m, rated;
    for (trial = 0; trial < 60; trial++)
        for (m = 1; m <= 2; m++)
            for (rated = 0; rated < (m == 1 || trial % 10 == 0 ? 2 : 1); rated++) {
                const int P = 2 * m, codes = (int)(pow(3, P * (1 + rated)) + 0.5);
                ld least = INFINITY;
                int code, i;
                draw(3, m, 2, rated, trial % 3 == 0 ? 1 : 3, &s, &p);
                if (trial % 4 == 1) lessen(&other, &p);
                condense(&p);
                CHECK(solve(&p, 30, u) == ROLN_OK);
                for (code = 0; code < codes; code++)
                    if (corner(&p, code, v, &cost) && cost < least) least = cost, memcpy(best, v, sizeof best);
                for (i = 0; i < P; i++) {
                    BOUND("corners: u", fabsl(u[i] - best[i]), PICK(1e-3L, 1e-7L));
                    active += fabsl(best[i]) >= 1 - 1e-12L;
                    lower += p.lessened && fabsl(best[i]) >= top_of(&p, i) - 1e-12L;
                }
                BOUND("corners: cost", (cost_of(&p, u, NULL) - least) / size_of(&p, best), PICK(3e-5L, 1e-12L));
                BOUND("corners: gap", cost_of(&p, u, NULL) - least - (ld)p.duality_gap, 20 * EPS * size_of(&p, best));
            }
    CHECK(active > 50);
    CHECK(lower > 20);
}

/* Twenty steps: coordinate descent, each u_i in turn to where the cost is least within its limits, until nothing moves. */
static void descend(const problem *p, ld *u)
{
    const int P = p->steps * p->m;
    int sweep, i, j;
    ld moved = 1;
    memset(u, 0, sizeof(ld) * (size_t)P);
    for (sweep = 0; sweep < 100000 && moved > 1e-14L; sweep++)
        for (moved = 0, i = 0; i < P; i++) {
            ld g = p->g[i], to;
            for (j = 0; j < P; j++)
                g += p->H[i * P + j] * u[j];
            to = u[i] - g / p->H[i * P + i];
            to = fmaxl(-top_of(p, i), fminl(top_of(p, i), to));
            moved = fabsl(to - u[i]) > moved ? fabsl(to - u[i]) : moved;
            u[i] = to;
        }
}

static void test_long(void)
{
    static problem p;
    static ld u[MAXP], best[MAXP];
    static const int iterations[3] = {1, 6, 8};
    uint64_t s = 3, other = 13;
    int trial, i, k, active = 0;
    for (trial = 0; trial < 24; trial++) {
        ld least, zero, cost;
        draw(1 + trial % MAXN, 1 + trial % MAXM, MAXH, 0, trial % 2 ? 1 : 10, &s, &p);
        if (trial % 4 == 2) lessen(&other, &p);
        condense(&p);
        descend(&p, best);
        least = cost_of(&p, best, NULL);
        for (i = 0; i < MAXH * p.m; i++)
            active += fabsl(best[i]) >= 1;
        memset(u, 0, sizeof u);
        zero = cost_of(&p, u, NULL);
        for (k = 0; k < 3; k++) {
            CHECK(solve(&p, iterations[k], u) == ROLN_OK);
            cost = cost_of(&p, u, NULL);
            BOUND("long: gap", (cost - least - (ld)p.duality_gap) / size_of(&p, best), 20 * EPS);
            if (p.lessened && k == 1) BOUND("long, less: part left after 6", (cost - least) / (zero - least), 5e-3L);
            else if (k == 1) BOUND("long: part left after 6", (cost - least) / (zero - least), 1e-3L);
            else if (k == 2 && !p.lessened) BOUND("long: part left after 8", (cost - least) / (zero - least), 1e-4L);
        }
        CHECK(solve(&p, 40, u) == ROLN_OK);
        for (i = 0; i < MAXH * p.m; i++)
            BOUND("long: u", fabsl(u[i] - best[i]), PICK(0.05L, 1e-6L));
    }
    CHECK(active > 200);
}

/* With rates: no other course within all limits costs less, to the gap. */
static void test_rates(void)
{
    static problem p;
    static ld u[MAXP], v[MAXP], g[MAXP];
    uint64_t s = 4;
    int trial, other, i, active = 0;
    for (trial = 0; trial < 40; trial++) {
        const int m = 1 + trial % MAXM, P = MAXH * m;
        draw(1 + trial % MAXN, m, MAXH, 1, trial % 2 ? 1 : 10, &s, &p);
        condense(&p);
        CHECK(solve(&p, 12, u) == ROLN_OK);
        cost_of(&p, u, g);
        for (i = 0; i < P; i++)
            active += fabsl(u[i] - (i < m ? (ld)p.last[i] : u[i - m])) >= 0.999L * (ld)p.rate[i % m];
        for (other = 0; other < 200; other++) {
            ld down = 0;
            for (i = 0; i < P; i++) { /* at random, or down the gradient */
                const ld last = i < m ? (ld)p.last[i] : v[i - m], most = (ld)p.rate[i % m];
                ld to = other % 4 == 0 ? (g[i] > 0 ? -1 : 1) : other % 4 == 1 ? u[i] : 0;
                to += other > 3 ? (ld)roln_normal(&s) / 4 : 0;
                to = to > last + most ? last + most : to < last - most ? last - most : to;
                v[i] = to > 1 ? 1 : to < -1 ? -1 : to;
                down += g[i] * (v[i] - u[i]);
            }
            BOUND("rates: gap", (-down - (ld)p.duality_gap) / size_of(&p, u), 20 * EPS);
        }
        BOUND("rates: size of the gap", (ld)p.duality_gap / size_of(&p, u), PICK(1e-3L, 1e-4L));
    }
    CHECK(active > 200);
}

/* The problem p in other units: u_j by[j], x_i of[i]; with own limits, or with limits of 1 in their units (most NULL). */
static void rescale(const problem *p, const roln_real *by, const roln_real *of, problem *c)
{
    const int n = p->n, m = p->m;
    int i, j;
    *c = *p;
    for (i = 0; i < p->steps * n * n; i++) {
        const roln_real row = of[i / n % n], column = of[i % n];
        c->A[i] = p->A[i] * row / column, c->Q[i] = p->Q[i] / row / column;
    }
    for (i = 0; i < p->steps * n * m; i++)
        c->B[i] = p->B[i] * of[i / m % n] / by[i % m];
    for (i = 0; i < p->steps * n; i++)
        c->q[i] = p->q[i] / of[i % n];
    for (j = 0; j < m; j++) {
        c->r[j] = p->r[j] / by[j] / by[j], c->ref[j] = p->ref[j] * by[j], c->last[j] = p->last[j] * by[j];
        c->rate[j] = p->rate[j] * by[j], c->most[j] = p->most[j] * by[j];
    }
    for (i = 0; i < p->steps * m; i++)
        c->at[i] = p->at[i] * by[i % m];
}

/* Units of motors and of states over twelve decades: by powers of two the same bits, by powers of ten the same but for rounding. */
static void test_units(void)
{
    static problem p, c;
    static ld u[MAXP], v[MAXP];
    uint64_t s = 6;
    int trial, i, j;
    for (trial = 0; trial < 60; trial++) {
        const int binary = trial % 2, m = 1 + trial / 2 % MAXM;
        roln_real by[MAXM], of[MAXN];
        roln_ocp o;
        draw(1 + trial % MAXN, m, MAXH, trial / 2 % 2, trial % 3 ? 1 : 10, &s, &p);
        for (j = 0; j < m; j++)
            by[j] = (roln_real)(binary ? ldexp(1, roln_randint(41, &s) - 20) : pow(10, roln_randint(13, &s) - 6));
        for (i = 0; i < p.n; i++)
            of[i] = (roln_real)(binary ? ldexp(1, roln_randint(41, &s) - 20) : pow(10, roln_randint(13, &s) - 6));
        CHECK(solve(&p, binary ? 8 : 20, u) == ROLN_OK);
        rescale(&p, by, of, &c);
        o = ocp_of(&c);
        CHECK(roln_ocp_solve(&o, binary ? 8 : 20, c.u, c.x, c.K, &c.duality_gap, room_of(ROLN_OCP_WORK(c.n, m, MAXH, c.rated))) ==
              ROLN_OK);
        widen(MAXH * m, c.u, v);
        for (i = 0; i < MAXH * m; i++) {
            v[i] /= (ld)by[i % m];
            BOUND(binary ? "units: powers of two" : "units: u", fabsl(v[i] - u[i]), binary ? 0 : PICK(1e-4L, 1e-12L));
        }
        condense(&p);
        if (!binary) BOUND("units: cost", fabsl(cost_of(&p, u, NULL) - cost_of(&p, v, NULL)) / size_of(&p, u), PICK(1e-7L, 1e-15L));
        for (i = 0; i < MAXH * m * p.n && binary; i++) {
            const roln_real K = c.K[i] * of[i % p.n] / by[i / p.n % m];
            CHECK(K >= p.K[i] && K <= p.K[i]);
        }
    }
}

/* A motor's limit of size that is never reached, from twice what is reached to the largest number: the same torques, the same cost.
   Other motors are at theirs. Both ways to say it: in units of that limit (most NULL), and most itself. */
static void test_far(void)
{
    static const double times[5] = {10, 1e3, 1e6, 1e9, PICK(1e15, 1e100)};
    static problem p, c;
    static ld u[MAXP], v[MAXP];
    uint64_t s = 7;
    int trial, i, j, k, own, active = 0;
    for (trial = 0; trial < 40; trial++) {
        const int m = 1 + trial / 2 % MAXM, rated = trial % 2;
        roln_real top = 0;
        draw(1 + trial % MAXN, m, MAXH, rated, trial % 3 ? 1 : 10, &s, &p);
        if (rated) p.last[0] /= 4, p.rate[0] /= 16;
        p.most[0] = ROLN_C(1e5); /* once, to see what is reached */
        CHECK(solve(&p, 30, u) == ROLN_OK);
        for (i = 0; i < MAXH * m; i++) {
            if (i % m == 0) top = ROLN_MAX(top, ROLN_ABS(p.u[i]));
            else active += fabsl(u[i]) > 0.999L;
        }
        p.most[0] = 2 * top;
        condense(&p);
        CHECK(solve(&p, 30, u) == ROLN_OK);
        for (k = 0; k < 6; k++)
            for (own = 0; own < 2; own++) {
                roln_real by[MAXM], of[MAXN];
                const roln_real far = k < 5 ? top * (roln_real)times[k] : (roln_real)PICK(3e38, 1e308);
                roln_ocp o;
                if (!own && k > 3) continue; /* r, in units of such a limit, has too few digits */
                for (j = 0; j < MAXN; j++)
                    of[j] = by[j % MAXM] = 1;
                c = p;
                if (own) c.most[0] = far;
                else by[0] = 1 / far, rescale(&p, by, of, &c);
                o = ocp_of(&c);
                if (!own) o.most = NULL;
                CHECK(roln_ocp_solve(&o, 30, c.u, c.x, c.K, &c.duality_gap, room_of(ROLN_OCP_WORK(c.n, m, MAXH, rated))) ==
                      ROLN_OK);
                widen(MAXH * m, c.u, v);
                for (i = 0; i < MAXH; i++)
                    v[i * m] /= (ld)by[0];
                BOUND("far: cost", (cost_of(&p, v, NULL) - cost_of(&p, u, NULL)) / size_of(&p, u), PICK(1e-6L, 1e-14L));
                for (j = 0; j < MAXH * m; j++)
                    BOUND("far: u", fabsl(v[j] - u[j]) / (1 + (ld)top), PICK(1e-4L, 1e-12L));
            }
    }
    CHECK(active > 100);
}

/* Where the start is the best there is, or nearly, no limit that is never reached makes a difference, and with any unit of the cost
   the torques are the same. */
static void test_nothing_to_do(void)
{
    static problem p, c;
    static ld u[MAXP], v[MAXP];
    uint64_t s = 17;
    int trial, k, i;
    for (trial = 0; trial < 20; trial++) {
        const int m = 1 + trial % MAXM, n = 1 + trial % MAXN, rated = trial % 2;
        draw(n, m, MAXH, rated, 1, &s, &p);
        for (k = 0; k < 6; k++) { /* no cost but of being moved */
            const double far[6] = {1, 1e9, 1e15, 1e25, 1e30, PICK(3e38, 1e308)};
            c = p;
            memset(c.q, 0, sizeof c.q), memset(c.at, 0, sizeof c.at), memset(c.ref, 0, sizeof c.ref);
            memset(c.last, 0, sizeof c.last);
            for (i = 0; i < m; i++) c.most[i] = (roln_real)far[k];
            for (i = 0; i < m && rated; i++) c.rate[i] = (roln_real)(far[k] / 4);
            if (!CHECK(solve(&c, 6, v) == ROLN_OK)) continue;
            CHECK_BELOW(c.duality_gap, 1e-20);
            for (i = 0; i < MAXH * m; i++) CHECK_BELOW(fabsl(v[i]), 1e-12L);
        }
        CHECK(solve(&p, 30, u) == ROLN_OK);
        for (k = -24; k <= 24; k += 12) { /* another unit of the cost */
            const roln_real by = (roln_real)ldexp(1, 3 * k);
            c = p;
            for (i = 0; i < MAXN * MAXN * MAXH; i++) c.Q[i] *= by;
            for (i = 0; i < MAXN * MAXH; i++) c.q[i] *= by;
            for (i = 0; i < MAXM; i++) c.r[i] *= by;
            CHECK(solve(&c, 30, v) == ROLN_OK);
            for (i = 0; i < MAXH * m; i++) BOUND("another unit of the cost: u", fabsl(v[i] - u[i]), PICK(1e-4L, 1e-9L));
        }
    }
}

/* u_-1 at its limit, or anywhere, and rates from much to less than a digit of it: there is a plan, within the limits, that goes
   where the cost wants it as fast as it may. */
static void test_at_limit(void)
{
    static problem p;
    static ld u[MAXP];
    uint64_t s = 8;
    int k, side, m, i;
    for (k = 0; k <= 24; k++)
        for (side = -2; side <= 2; side++)
            for (m = 1; m <= 2; m++) {
                const roln_real rate = (roln_real)pow(10, -k), last = (roln_real)side / 2;
                draw(2, m, MAXH, 1, 1, &s, &p);
                for (i = 0; i < m; i++)
                    p.rate[i] = rate, p.last[i] = last, p.ref[i] = side > 0 ? -100 : 100, p.r[i] = 10;
                if (!CHECK(solve(&p, 12, u) == ROLN_OK)) printf("    rate 1e-%d, last %g\n", k, (double)last);
                for (i = 0; i < MAXH * m; i++) {
                    const ld to = (ld)last + (side > 0 ? -1 : 1) * (ld)(i / m + 1) * (ld)rate;
                    const ld off = fabsl(u[i] - (to < -1 ? -1 : to > 1 ? 1 : to));
                    BOUND("at limit", off, (1e-3L * (ld)rate + EPS) * (i / m + 1));
                }
            }
}

/* A chain of n / 2 masses with springs of stiffness k between them, m motors, that is to move its first mass by `way`. Steps,
   masses and weights over decades. */
static void draw_chain(int rated, uint64_t *s, problem *p)
{
    const int n = 2 * (1 + roln_randint(3, s)), m = 1 + roln_randint(2, s), d = n / 2, steps = 5 + roln_randint(LONG - 4, s);
    const roln_real h = roln_exp(ROLN_C(-4.6) * roln_uniform(s)), way = roln_exp(ROLN_C(9.2) * roln_uniform(s) - ROLN_C(4.6));
    const roln_real stiff = roln_exp(7 * roln_uniform(s) - ROLN_C(2.3)), stable = ROLN_C(0.5) / (h * h);
    const roln_real k = roln_uniform(s) > ROLN_C(0.3) ? ROLN_MIN(stiff, stable) : 0;
    const roln_real end = roln_uniform(s) > ROLN_C(0.5) ? 1 : roln_exp(7 * roln_uniform(s));
    roln_real weight[MAXN], push[MAXN];
    int i, j, l;
    memset(p, 0, sizeof *p);
    p->n = n, p->m = m, p->steps = steps, p->rated = rated;
    for (i = 0; i < n; i++)
        weight[i] = roln_exp(ROLN_C(11.5) * roln_uniform(s) - ROLN_C(9.2)), push[i] = h * (ROLN_C(0.2) + 5 * roln_uniform(s));
    for (l = 0; l < steps; l++) {
        roln_real *const A = p->A + l * n * n;
        for (i = 0; i < d; i++) {
            A[(d + i) * (n + 1)] = 1;
            for (j = i - 1; j <= i + 1; j += 2)
                if (j >= 0 && j < d) A[(d + i) * n + j] += k * h, A[(d + i) * n + i] -= k * h;
            for (j = 0; j < n; j++) /* by the velocity at the end of the step */
                A[i * n + j] = h * A[(d + i) * n + j] + (i == j);
        }
        for (j = 0; j < m; j++)
            p->B[(l * n + d + j % d) * m + j] = push[j];
        for (i = 0; i < n; i++)
            p->Q[l * n * n + i * (n + 1)] = weight[i] * (l == steps - 1 ? end : 1);
        p->q[l * n] = -way * p->Q[l * n * n];
    }
    for (j = 0; j < m; j++) {
        p->r[j] = roln_exp(ROLN_C(-16.0) * roln_uniform(s)), p->most[j] = 1;
        p->rate[j] = roln_exp(ROLN_C(-6.9) * roln_uniform(s));
        p->last[j] = roln_uniform(s) > ROLN_C(0.5) ? 0 : 2 * roln_uniform(s) - 1;
    }
}

/* The cost of u from its definition, by the states. */
static ld rolled(const problem *p, const ld *u)
{
    ld x[MAXN] = {0}, next[MAXN], sum = 0;
    int k, i, j;
    for (k = 0; k < p->steps; k++) {
        for (i = 0; i < p->n; i++) {
            for (next[i] = 0, j = 0; j < p->n; j++)
                next[i] += (ld)p->A[(k * p->n + i) * p->n + j] * x[j];
            for (j = 0; j < p->m; j++)
                next[i] += (ld)p->B[(k * p->n + i) * p->m + j] * (u[k * p->m + j] - (ld)p->at[k * p->m + j]);
        }
        memcpy(x, next, sizeof x);
        for (i = 0; i < p->n; i++)
            for (sum += (ld)p->q[k * p->n + i] * x[i], j = 0; j < p->n; j++)
                sum += x[i] * (ld)p->Q[(k * p->n + i) * p->n + j] * x[j] / 2;
        for (j = 0; j < p->m; j++) {
            const ld e = u[k * p->m + j] - (ld)p->ref[j];
            sum += (ld)p->r[j] * e * e / 2;
        }
    }
    return sum;
}

/* The part that iterations leave of what the start costs more than the best, over many problems: chains, and systems at random.
   With rates the start is the costlier of two, to keep u_-1 and to go to 0. */
static void test_left(void)
{
    static problem p;
    static ld u[LONG * MAXM], best[LONG * MAXM];
    const int tries = check_sample ? 400 : 3000;
    uint64_t s = 9;
    int trial, rated, i;
    for (rated = 0; rated < 2; rated++) {
        int over = 0, all = 0, refused = 0;
        for (trial = 0; trial < tries; trial++) {
            ld least, before, left;
            if (trial % 4 > 0) draw_chain(rated, &s, &p);
            else draw(1 + roln_randint(MAXN, &s), 1 + roln_randint(MAXM, &s), MAXH, rated, trial % 8 ? 1 : 10, &s, &p);
            for (i = 0; i < p.steps * p.m; i++)
                u[i] = rated ? (ld)p.last[i % p.m] : 0;
            before = rolled(&p, u);
            for (i = 0; i < p.steps * p.m && rated; i++) {
                const ld last = (ld)p.last[i % p.m], fall = (ld)(i / p.m + 1) * (ld)p.rate[i % p.m];
                u[i] = fabsl(last) <= fall ? 0 : last > 0 ? last - fall : last + fall;
            }
            least = rolled(&p, u), before = ROLN_MAX(before, least);
            if (within(&p, 50, best) != ROLN_OK || within(&p, rated ? 8 : 6, u) != ROLN_OK) {
                refused++;
                continue;
            }
            least = rolled(&p, best), left = (rolled(&p, u) - least) / (before - least);
            if (!(before - least > 1e4L * EPS * (fabsl(before) + fabsl(least)))) continue; /* nothing is to be gained */
            all++, over += left > 1e-3L;
            BOUND(rated ? "left after 8, with rates" : "left after 6", left, 0.005L);
        }
        CHECK(refused <= PICK(tries / 100, 0)); /* digits: unstable motion, small weights of torque */
        CHECK(all > tries * 8 / 10);
        BOUND("more than a thousandth is left, of all", (ld)over / all, 0.01L);
    }
}

/* Sizes of costs from tiny to huge do not matter. */
static void test_sizes(void)
{
    static problem p, c;
    static ld u[MAXP];
    uint64_t s = 5;
    int i, k;
    draw(4, 2, 5, 1, 2, &s, &p);
    for (k = -12; k <= 12; k += 4) {
        const roln_real by = (roln_real)pow(10, k);
        c = p;
        for (i = 0; i < 5 * 16; i++)
            c.Q[i] *= by;
        for (i = 0; i < 20; i++)
            c.q[i] *= by;
        for (i = 0; i < 2; i++)
            c.r[i] *= by;
        condense(&c);
        CHECK(solve(&c, 10, u) == ROLN_OK);
        BOUND("sizes of costs", (ld)c.duality_gap / size_of(&c, u), PICK(1e-3L, 1e-4L));
    }
}

/* Every number that makes no sense has its status. */
static void test_refused(void)
{
    static problem p, c;
    static const roln_real wrong[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    static ld u[MAXP];
    uint64_t s = 5;
    int i, k;
    draw(4, 2, 5, 1, 2, &s, &p);
    for (k = 0; k < 3; k++) {
        roln_real *const at[9] = {c.A + 7, c.B + 9, c.Q + 11, c.q + 3, c.r + 1, c.ref, c.at + 4, c.rate + 1, c.last};
        for (i = 0; i < 9; i++) {
            c = p;
            *at[i] = wrong[k];
            CHECK(solve(&c, 8, u) == (i == 7 || i == 8 ? ROLN_E_RANGE : ROLN_E_NOT_FINITE));
        }
    }
    c = p, c.r[1] = 0;
    CHECK(solve(&c, 8, u) == ROLN_E_NOT_SPD);
    c = p, c.rate[0] = 0;
    CHECK(solve(&c, 8, u) == ROLN_E_RANGE);
    c = p, c.last[1] = ROLN_C(-1.5);
    CHECK(solve(&c, 8, u) == ROLN_E_RANGE);
    for (k = 0; k < 5; k++) {
        c = p, c.most[1] = k < 3 ? wrong[k] : (roln_real)(3 - k);
        CHECK(solve(&c, 8, u) == ROLN_E_RANGE);
    }
    for (k = 0; k < 5; k++) {
        c = p, c.lessened = 1, memset(c.less, 0, sizeof c.less);
        c.less[9] = k < 3 ? wrong[k] : k == 3 ? ROLN_C(-0.0625) : c.most[1];
        CHECK(solve(&c, 8, u) == ROLN_E_RANGE);
    }
    for (k = 0; k < 3; k++) {
        c = p;
        *(k == 0 ? &c.n : k == 1 ? &c.m : &c.steps) = 0;
        CHECK(solve(&c, 8, u) == ROLN_E_LENGTH);
    }
    c = p;
    for (i = 0; i < 5 * 16; i++)
        c.Q[i] *= -100;
    CHECK(solve(&c, 8, u) == ROLN_E_NOT_SPD);
    c = p; /* nothing is to be done */
    memset(c.q, 0, sizeof c.q), c.rated = 0;
    for (i = 0; i < 10; i++)
        c.at[i] = c.ref[i % 2];
    CHECK(solve(&c, 8, u) == ROLN_OK);
    for (i = 0; i < 10; i++)
        BOUND("nothing to do", fabsl(u[i] - (ld)c.ref[i % 2]), PICK(1e-5L, 1e-12L));
    memset(c.ref, 0, sizeof c.ref), memset(c.at, 0, sizeof c.at); /* from u = 0 on */
    CHECK(solve(&c, 0, u) == ROLN_E_LENGTH && solve(&c, 8, u) == ROLN_OK);
    for (i = 0; i < 10; i++)
        BOUND("nothing to do", fabsl(u[i]), PICK(1e-5L, 1e-12L));
    c = p;
    for (i = 0; i < 5 * 16; i++)
        c.A[i] *= (roln_real)PICK(1e20, 1e160);
    CHECK(solve(&c, 8, u) != ROLN_OK); /* A^T Q A is not finite */
}

void TEST_NAME(ocp)(void)
{
    test_free();
    test_less();
    test_corners();
    test_long();
    test_rates();
    test_units();
    test_far();
    test_nothing_to_do();
    test_at_limit();
    test_left();
    test_sizes();
    test_refused();
    print_bounds();
}
