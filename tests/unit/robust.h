/* SPDX-License-Identifier: MIT */
/* robust.h - soft limits of the plans of one model, for test_robust.c. Include behind the model, with ROBUST(x) = NAME_x. Defines
   NAME_test_robust() and NAME_start_model(). */
#define R__(x) ROBUST(x)
#define R_(x) R__(test_##x)

/* A model of random weights with a range. */
static void R__(start_model)(R__(params) *p)
{
    static R__(start) w;
    uint64_t seed = 5;
    int i;
    CHECK_OK(R__(init)(p, &seed, &w.init));
    p->scale.q = R__(angles) ? 1 : 2, p->scale.t = ROLN_C(0.5), p->scale.m = ROLN_C(0.25);
    for (i = 0; i < R__(n); i++)
        p->z_min[i] = -4, p->z_max[i] = 4, p->zd_max[i] = 20;
}

/* A goal, its terms and limits: one of each kind of output, plain and by a matrix, all of which point into it. */
typedef struct {
    roln_real C[2 * R__(N)], weight[R__(N)], low[R__(N)], high[R__(N)], tighten[R__(steps) * R__(N)];
    roln_real reserve[R__(steps) * R__(motors)], B[R__(N) * R__(motors)], u[R__(motors)], ref[R__(N)];
    roln_term term[2];
    roln_motors motors;
    roln_limits limits;
    roln_goal goal;
} R_(task);

/* Limits of output `what`, 0 .. 7: q, qd, z, zd, by a matrix from 4 on. The first term is a reference for z beyond them. */
static void R_(place)(int what, uint64_t *s, R_(task) *x)
{
    enum { N = R__(N), n = R__(n) };
    int i;
    memset(x, 0, sizeof *x);
    for (i = 0; i < 2 * N; i++)
        x->C[i] = roln_normal(s);
    for (i = 0; i < N; i++) {
        x->weight[i] = ROLN_C(0.5) + roln_uniform(s), x->high[i] = ROLN_C(0.25) * roln_uniform(s), x->low[i] = -x->high[i];
        x->ref[i] = i % 2 ? ROLN_C(-0.5) : ROLN_C(0.5);
    }
    for (i = 0; i < R__(steps) * N; i++)
        x->tighten[i] = roln_uniform(s) / 8;
    for (i = 0; i < N * R__(motors); i++)
        x->B[i] = roln_normal(s);
    for (i = 0; i < R__(motors); i++)
        x->u[i] = ROLN_C(0.015625);
    x->term[0].of = ROLN_OF_Z, x->term[0].weight = x->weight, x->term[0].ref = x->ref;
    x->term[1].of = what % 4, x->term[1].weight = x->weight, x->term[1].low = x->low, x->term[1].high = x->high;
    x->term[1].C = what < 4 ? NULL : x->C, x->term[1].count = what < 4 ? 0 : 2, x->term[1].last = 1;
    x->motors.count = R__(motors), x->motors.B = x->B;
    x->limits.dt = ROLN_C(0.0625), x->limits.tau = 4, x->limits.margin = 10, x->limits.motors = &x->motors;
    x->goal.dt = ROLN_C(0.0625), x->goal.terms = 2, x->goal.term = x->term, x->goal.u = x->u, x->goal.limits = &x->limits;
}

/* The outputs of the second term at s [2n]. Returns how many. */
static int R_(outputs)(const R__(params) *p, const R_(task) *x, const roln_real *s, ld *y)
{
    enum { N = R__(N), n = R__(n) };
    static R__(work) w;
    const roln_term *f = x->term + 1;
    const int joints = f->of == ROLN_OF_Q || f->of == ROLN_OF_QD, side = joints ? N : n, count = f->C ? 2 : side;
    R__(latent) at;
    R__(state) q;
    const roln_real *from;
    int i, j;
    memcpy(at.z, s, sizeof at.z), memcpy(at.zd, s + n, sizeof at.zd);
    CHECK_OK(R__(decode)(p, &at, &q, &w.decode));
    from = f->of == ROLN_OF_Q ? q.q : f->of == ROLN_OF_QD ? q.qd : f->of == ROLN_OF_Z ? at.z : at.zd;
    for (i = 0; i < count; i++)
        for (y[i] = f->C ? 0 : (ld)from[i], j = 0; j < side && f->C; j++)
            y[i] += (ld)f->C[i * side + j] * (ld)from[j];
    return count;
}

/* Cost, gradient and curvature of a limit at a state, judged at the state or ahead of it. */
static void R_(cost)(int what, uint64_t *seed)
{
    enum { N = R__(N), n = R__(n), n2 = 2 * n };
    static R__(params) p;
    static R__(i_goal_work) w;
    static R_(task) x;
    const int k = what % 2 ? R__(steps) - 1 : 2, fast = what % 2, side = what % 4 < 2 ? N : n;
    const ld h = PICK(1e-2L, 1e-4L), tol = PICK(1e-2L, 1e-7L), of = k > 2 ? 2 : 1;
    roln_real s[n2], Q[n2 * n2], q[n2], cost = 0;
    ld y[N], row[N][n2] = {{0}}, sum = 0, slope, bent, g[n2] = {0}, H[n2 * n2] = {0};
    int i, j, l, count, ahead = roln_uniform(seed) < ROLN_C(0.5);
    R__(start_model)(&p);
    R_(place)(what, seed, &x);
    if (roln_uniform(seed) < ROLN_C(0.5)) x.term[1].tighten = x.tighten;
    if (roln_uniform(seed) < ROLN_C(0.2)) x.term[1].low = NULL;
    if (roln_uniform(seed) < ROLN_C(0.2)) x.high[0] = (roln_real)INFINITY, x.low[1] = -(roln_real)INFINITY;
    for (i = 0; i < n2; i++)
        s[i] = roln_normal(seed) / 4, w.ahead[i] = ahead ? roln_normal(seed) / 4 : 0;
    x.goal.terms = 1, x.goal.term = x.term + 1;
    CHECK_OK(R__(i_goal_at)(&p, &x.goal, k, s, &cost, Q, q, &w));
    count = R_(outputs)(&p, &x, s, y);
    for (j = 0; j < n2; j++) {
        roln_real plus[n2], minus[n2];
        ld y1[N], y0[N];
        memcpy(plus, s, sizeof s), memcpy(minus, s, sizeof s);
        plus[j] += (roln_real)h, minus[j] -= (roln_real)h;
        R_(outputs)(&p, &x, plus, y1), R_(outputs)(&p, &x, minus, y0);
        for (i = 0; i < count; i++)
            row[i][j] = (y1[i] - y0[i]) / ((ld)plus[j] - (ld)minus[j]);
    }
    for (i = 0; i < count; i++) {
        const ld c = of * (ld)x.weight[i], inside = x.term[1].tighten ? (ld)x.tighten[k * (what < 4 ? side : 2) + i] : 0;
        ld on = 0;
        for (j = fast * n; j < fast * n + n; j++)
            on += row[i][j] * (ld)w.ahead[j];
        sum += c * hinge(y[i], on, x.term[1].low ? x.low + i : NULL, x.high + i, inside, &slope, &bent);
        for (j = 0; j < n2; j++)
            for (g[j] += c * slope * row[i][j], l = 0; l < n2; l++)
                if (j / n == fast && l / n == fast) H[j * n2 + l] += c * bent * row[i][j] * row[i][l];
    }
    CHECK_NEAR(cost, sum, 64 * (ld)ROLN_EPS * (1 + sum) + PICK(1e-5L, 0));
    for (i = 0; i < n2; i++)
        CHECK_NEAR(q[i], g[i], tol * (1 + fabsl(g[i])));
    for (i = 0; i < n2 * n2; i++)
        CHECK_NEAR(Q[i], H[i], tol * (1 + fabsl(H[i])));
    for (j = 0; j < n2 && !ahead; j++) { /* the gradient, by differences of the cost */
        roln_real at[n2], end[2] = {0, 0};
        ld curved = 1;
        for (i = 0; i < count; i++)
            curved += 4 * of * (ld)x.weight[i] * row[i][j] * row[i][j];
        for (i = 0; i < 2; i++) {
            memcpy(at, s, sizeof at), at[j] += (roln_real)(i ? h : -h);
            CHECK_OK(R__(i_goal_at)(&p, &x.goal, k, at, end + i, NULL, NULL, &w));
        }
        CHECK_NEAR(q[j], ((ld)end[1] - (ld)end[0]) / (2 * h), h * curved); /* where a limit begins, of first order */
    }
}

/* Limits far off, and tightened by nothing, change no bit of plans. */
static void R_(nothing)(int what)
{
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan[4];
    static R__(plan_next_work) w;
    uint64_t seed = 40;
    int k, way, i;
    R__(start_model)(&p);
    R_(place)(what, &seed, &x);
    memset(plan, 0, sizeof plan);
    for (way = 0; way < 4; way++) { /* without; off; tightened by nothing; not tightened */
        R__(latent) s = {{0}, {0}};
        for (i = 0; i < R__(N); i++)
            x.high[i] = way == 1 ? 100 + (roln_real)i : ROLN_C(0.0625),
            x.low[i] = way == 1 && i % 2 ? -(roln_real)INFINITY : -x.high[i] * 2;
        memset(x.tighten, 0, sizeof x.tighten), memset(x.reserve, 0, sizeof x.reserve);
        x.goal.terms = way == 0 ? 1 : 2;
        x.term[1].tighten = way == 2 ? x.tighten : NULL, x.goal.reserve = way == 2 || way == 1 ? x.reserve : NULL;
        x.limits.rate = (roln_real)(what % 2 ? 8 : 0);
        for (k = 0; k < 4; k++) {
            CHECK_OK(R__(plan_next)(&p, &x.goal, &s, plan + way, &w));
            s = plan[way].s[1];
        }
    }
    CHECK(memcmp(plan[0].u, plan[1].u, sizeof plan->u) == 0 && memcmp(plan[0].K, plan[1].K, sizeof plan->K) == 0);
    CHECK(memcmp(plan[2].u, plan[3].u, sizeof plan->u) == 0 && memcmp(plan[2].K, plan[3].K, sizeof plan->K) == 0);
    CHECK(what % 4 != ROLN_OF_Z || memcmp(plan[0].u, plan[2].u, sizeof plan->u) != 0);
}

/* Plans that are led beyond limits of z keep them behind each step, as they are tightened; without, they do not. */
static void R_(keeps)(int rated)
{
    enum { n = R__(n) };
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(plan_next_work) w;
    static const roln_real heavy[8] = {30000, 30000, 30000, 30000, 30000, 30000, 30000, 30000};
    uint64_t seed = 41;
    int way, k, i;
    R__(start_model)(&p);
    R_(place)(ROLN_OF_Z, &seed, &x);
    for (i = 0; i < R__(N); i++)
        x.high[i] = ROLN_C(0.25), x.low[i] = ROLN_C(-0.25);
    for (i = 0; i < R__(steps) * n; i++)
        x.tighten[i] = ROLN_C(0.015625) * (roln_real)(i / n);
    x.term[1].weight = heavy, x.term[1].last = 0, x.limits.tau = 40, x.limits.rate = (roln_real)(rated ? 400 : 0);
    for (way = 0; way < 3; way++) { /* without limits, with, tightened */
        R__(latent) s = {{0}, {0}};
        ld most = 0;
        memset(&plan, 0, sizeof plan);
        x.goal.terms = way > 0 ? 2 : 1;
        x.term[1].tighten = way == 2 ? x.tighten : NULL;
        for (k = 0; k < 30; k++) {
            CHECK_OK(R__(plan_next)(&p, &x.goal, &s, &plan, &w));
            s = plan.s[1];
            for (i = 0; i < R__(steps) * n; i++) {
                const ld beyond = fabsl((ld)plan.s[i / n + 1].z[i % n]) + (way == 2 && k > 9 ? (ld)x.tighten[i] : 0) - 0.25L;
                most = beyond > most ? beyond : most;
            }
        }
        if (way == 0) CHECK(most > 0.05L);
        if (way > 0) CHECK_BELOW(most, 0.02L);
    }
}

/* A plan that asks for much leaves what is in reserve, and no more; another one, whose motors are where reserves are now, too. */
static void R_(reserved)(int rated)
{
    enum { m = R__(motors), COUNT = R__(steps) * m };
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(plan_next_work) w;
    const R__(latent) s = {{0}, {0}};
    uint64_t seed = 44;
    roln_real most = 0;
    int i, way, reached = 0;
    R__(start_model)(&p);
    R_(place)(ROLN_OF_Z, &seed, &x);
    x.goal.terms = 1, x.limits.tau = 1000, memset(&plan, 0, sizeof plan);
    CHECK_OK(R__(plan_next)(&p, &x.goal, &s, &plan, &w));
    for (i = 0; i < COUNT; i++)
        most = ROLN_MAX(most, ROLN_ABS(plan.u[i]));
    x.limits.tau = most / 2, x.goal.reserve = x.reserve, x.limits.rate = rated ? 32 * most : 0;
    for (i = 0; i < COUNT; i++)
        x.reserve[i] = most / 16 * (roln_real)(i / m + 1);
    for (way = 0; way < 2; way++) {
        memset(&plan, 0, sizeof plan);
        for (i = 0; i < COUNT && way; i++)
            plan.plan.valid = 1, plan.u[i] = i % 2 ? most / 2 : -most / 2;
        plan.plan.age = way; /* no feedback */
        CHECK_OK(R__(plan_next)(&p, &x.goal, &s, &plan, &w));
        for (i = 0; i < COUNT; i++) {
            const roln_real last = rated && way ? most / 2 : 0, fall = ROLN_MIN(last, (roln_real)(i / m + 1) * (most / 2));
            const roln_real top = ROLN_MAX(most / 2 - x.reserve[i], last - fall / 2);
            CHECK_BELOW(ROLN_ABS(plan.u[i]), top * (1 + 4 * ROLN_EPS));
            reached += ROLN_ABS(plan.u[i]) > ROLN_C(0.99) * top;
        }
    }
    CHECK(reached > 0);
}

/* Reserves that come and go faster than rates: torques and their changes are within the limits of the motors all the same. */
static void R_(rates)(void)
{
    enum { m = R__(motors), H = R__(steps) };
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(plan_next_work) w;
    R__(latent) s = {{0}, {0}};
    uint64_t seed = 45;
    int call, i, ok = 0, moved = 0;
    R__(start_model)(&p);
    R_(place)(ROLN_OF_Z, &seed, &x);
    for (i = 0; i < R__(n); i++)
        p.z_min[i] = -40, p.z_max[i] = 40, p.zd_max[i] = 200;
    x.goal.terms = 1, x.goal.reserve = x.reserve, memset(&plan, 0, sizeof plan);
    x.limits.tau = 2, x.limits.rate = 8;
    for (call = 0; call < 400; call++) {
        const roln_real step = x.limits.rate * x.goal.dt;
        for (i = 0; i < H * m && call % 10 == 0; i++)
            x.reserve[i] = roln_uniform(&seed) < ROLN_C(0.5) ? 0 : ROLN_C(1.9) * roln_uniform(&seed);
        for (i = 0; i < R__(n); i++)
            x.ref[i] = (call / 10 + i) % 2 ? -2 : 2, s.zd[i] += ROLN_C(0.05) * roln_normal(&seed);
        if (R__(plan_next)(&p, &x.goal, &s, &plan, &w) != ROLN_OK) continue;
        for (ok++, i = 0; i < H * m; i++) {
            CHECK_BELOW(ROLN_ABS(plan.u[i]), x.limits.tau * (1 + 4 * ROLN_EPS));
            if (i >= m) CHECK_BELOW(ROLN_ABS(plan.u[i] - plan.u[i - m]), step * (1 + 8 * ROLN_EPS));
            moved += i >= m && ROLN_ABS(plan.u[i] - plan.u[i - m]) > ROLN_C(0.9) * step;
        }
        s = plan.s[1];
    }
    CHECK(ok > 100 && moved > 100);
}

/* What limits are tightened by: the root of c P c^T, P the sum over pairs of errors i, j of their correlation times
   F_i G_i G_j^T F_j^T, F_i what the closed loop makes of an error of step i. Errors are means over steps of u times the time that
   they last. */
static void R_(sum)(int k, ld u, ld M[][4 * R__(n) * R__(n)], ld G[][2 * R__(n) * R__(n)], ld *P)
{
    enum { n = R__(n), n2 = 2 * n };
    static ld F[R__(steps)][n2 * n];
    int i, j, l, a, b, c;
    for (i = 0; i <= k; i++) {
        memcpy(F[i], G[i], sizeof F[i]);
        for (l = i + 1; l <= k; l++) {
            ld next[n2 * n] = {0};
            for (a = 0; a < n2; a++)
                for (b = 0; b < n; b++)
                    for (c = 0; c < n2; c++)
                        next[a * n + b] += M[l][a * n2 + c] * F[i][c * n + b];
            memcpy(F[i], next, sizeof next);
        }
    }
    memset(P, 0, sizeof(ld) * n2 * n2);
    for (i = 0; i <= k; i++)
        for (j = 0; j <= k; j++)
            for (a = 0; a < n2; a++)
                for (b = 0; b < n2; b++)
                    for (c = 0; c < n; c++)
                        P[a * n2 + b] += F[i][a * n + c] * F[j][b * n + c] *
                                         (i == j ? 2 * (u + expm1l(-u)) : expm1l(-u) * expm1l(-u) * expl(-u * (abs(i - j) - 1))) /
                                         (u * u);
}

/* A plan of x, evidence that knows of one state, and of the plan the closed loops M and the errors G. */
static void R_(known)(const R__(params) *p, R_(task) *x, R__(plan) *plan, R__(evidence) *e, ld M[][4 * R__(n) * R__(n)],
                      ld G[][2 * R__(n) * R__(n)])
{
    enum { n = R__(n), n2 = 2 * n, m = R__(motors), H = R__(steps) };
    static R__(plan_next_work) w;
    static R__(plan_linear_work) linear;
    static R__(train) train;
    static R__(work) tick;
    static roln_real A[H * n2 * n2], B[H * n2 * m], c[H * n2];
    const roln_real still[2 * R__(N)] = {0};
    const roln_batch b = {1, 0, 1, NULL, still, still + R__(N), NULL, NULL};
    const R__(latent) s = {{ROLN_C(0.25)}, {0}};
    const ld dt = (ld)x->goal.dt;
    int k, i, j, l;
    memset(plan, 0, sizeof *plan), memset(e, 0, sizeof *e);
    CHECK_OK(R__(plan_next)(p, &x->goal, &s, plan, &w));
    CHECK_OK(R__(evidence_add)(p, &b, e, &train.evidence_add));
    for (i = 0; i < n2; i++)
        e->always[i] = ROLN_C(0.25), e->grows[i] = (roln_real)(1 + i) / 8;
    e->halves = 2, e->lasts = ROLN_C(0.25);
    CHECK_OK(R__(plan_linear)(p, &x->goal, plan, A, B, c, &linear));
    for (k = 0; k < H; k++) {
        R__(doubts) d;
        CHECK_OK(R__(doubt)(p, e, plan->s + k, &d, &tick.doubt));
        for (i = 0; i < n2; i++)
            for (j = 0; j < n2; j++) {
                M[k][i * n2 + j] = (ld)A[(k * n2 + i) * n2 + j];
                for (l = 0; l < m; l++)
                    M[k][i * n2 + j] -= (ld)B[(k * n2 + i) * m + l] * (ld)plan->K[(k * m + l) * n2 + j];
            }
        memset(G[k], 0, sizeof G[k]);
        for (i = 0; i < n; i++)
            G[k][i * n + i] = dt * dt / 2 * (ld)d.zdd[i], G[k][(n + i) * n + i] = dt * (ld)d.zdd[i];
    }
}

static void R_(tightened)(int what)
{
    enum { N = R__(N), n = R__(n), n2 = 2 * n, m = R__(motors), H = R__(steps) };
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(evidence) e;
    static R__(plan_tighten_work) w;
    static R__(i_goal_work) pose;
    static ld M[H][n2 * n2], G[H][n2 * n], P[n2 * n2];
    roln_real to[H * (N > m ? N : m)];
    uint64_t seed = 42;
    int k, i, j, l;
    R__(start_model)(&p);
    R_(place)(what < 8 ? what : 0, &seed, &x);
    x.goal.terms = 1;
    R_(known)(&p, &x, &plan, &e, M, G);
    CHECK_OK(R__(plan_tighten)(&p, &e, &x.goal, &plan, what < 8 ? x.term + 1 : NULL, 3, to, &w));
    for (k = 0; k < H; k++) {
        const int joints = what < 8 && what % 4 < 2, fast = what < 8 && what % 2;
        const int side = joints ? N : n, count = what == 8 ? m : what < 4 ? side : 2;
        R_(sum)(what < 8 ? k : k - 1, (ld)x.goal.dt * 4, M, G, P);
        CHECK_OK(R__(i_pose)(&p, plan.s[k + 1].z, pose.gx, pose.J, &pose.u.pose));
        for (i = 0; i < count; i++) {
            ld row[n2] = {0}, sum = 0;
            for (j = 0; j < n2 && what == 8; j++)
                row[j] = (ld)plan.K[(k * m + i) * n2 + j];
            for (j = 0; j < n && what < 8; j++)
                for (l = 0; l < side; l++)
                    row[fast * n + j] += (what > 3 ? (ld)x.C[i * side + l] : l == i) * (joints ? (ld)pose.J[l * n + j] : l == j);
            for (j = 0; j < n2; j++)
                for (l = 0; l < n2; l++)
                    sum += row[j] * P[j * n2 + l] * row[l];
            CHECK_NEAR(to[k * count + i], 3 * sqrtl(sum), PICK(1e-4L, 1e-11L) * (1e-3L + 3 * sqrtl(sum)));
        }
    }
}

/* Limits on one side alone, and what is inside of a plan when its numbers fail on the way. */
static void R_(inside)(void)
{
    enum { n2 = 2 * R__(n), N = R__(N) };
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(plan_next_work) w;
    static R__(plan_tighten_work) tight;
    const R__(latent) s = {{0}, {0}};
    roln_real gap = 0, row[n2] = {1};
    uint64_t seed = 45;
    int side, what;
    R__(start_model)(&p);
    for (side = 0; side < 2; side++)
        for (what = 0; what < 3; what++) { /* a number, no limit, no number */
            R_(place)(ROLN_OF_Q, &seed, &x);
            x.term[1].low = side ? NULL : x.low, x.term[1].high = side ? x.high : NULL;
            x.low[1] = what == 2 ? (roln_real)NAN : what == 1 ? -(roln_real)INFINITY : -1;
            x.high[1] = -x.low[1];
            CHECK(R__(i_term_check)(x.term + 1, N) == (what == 2 ? ROLN_E_NOT_FINITE : ROLN_OK));
        }
    for (what = 0; what < 3; what++) {
        R_(place)(ROLN_OF_Z, &seed, &x);
        if (what == 2) x.term[1].low = NULL;
        memset(&plan, 0, sizeof plan);
        CHECK_OK(R__(plan_next)(&p, &x.goal, &s, &plan, &w));
        if (what == 0) w.q[0] = (roln_real)NAN; /* no solution */
        else w.s0[n2] = (roln_real)NAN;         /* one whose cost is no number */
        CHECK(R__(i_plan_within)(&p, &x.goal, &plan, &gap, &w) != ROLN_OK);
    }
    tight.o.P[0] = -1; /* as rounding may leave it, but smaller */
    CHECK(R__(i_tighten_of)(row, &tight) >= 0 && R__(i_tighten_of)(row, &tight) <= 0);
}

/* Statuses of NAME_plan_tighten. x: limits of z, and what belongs to them. */
static void R_(tighten_refused)(R__(params) *p, R_(task) *x, const R__(plan) *plan, R__(evidence) *e)
{
    enum { m = R__(motors), H = R__(steps) };
    const roln_real nan = (roln_real)NAN, inf = (roln_real)INFINITY;
    static R__(plan) none;
    static R__(plan_tighten_work) tight;
    roln_real to[H * R__(N)];
    int what;
    CHECK(R__(plan_tighten)(p, e, &x->goal, &none, x->term + 1, 1, to, &tight) == ROLN_E_LENGTH);
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, x->term + 1, -1, to, &tight) == ROLN_E_RANGE);
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, x->term + 1, nan, to, &tight) == ROLN_E_RANGE);
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, x->term + 1, inf, to, &tight) == ROLN_E_NOT_FINITE);
    for (what = -1; what < 5; what += 5) {
        x->term[1].of = what;
        CHECK(R__(plan_tighten)(p, e, &x->goal, plan, x->term + 1, 1, to, &tight) == ROLN_E_LENGTH);
    }
    x->term[1].of = ROLN_OF_Q, x->term[1].C = x->C, x->term[1].count = -1;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, x->term + 1, 1, to, &tight) == ROLN_E_LENGTH);
    x->term[1].C = NULL, none = *plan;
    none.s[H].z[0] = nan; /* where the last step ends */
    CHECK(R__(plan_tighten)(p, e, &x->goal, &none, x->term + 1, 1, to, &tight) == ROLN_E_NOT_FINITE);
    x->goal.dt = 0;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_RANGE);
    x->goal.dt = x->limits.dt, x->motors.mu = -1;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_LENGTH);
    x->motors.mu = 0, p->slope /= 2;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_SHAPE);
    p->slope *= 2, x->motors.count = 1;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_LENGTH);
    x->motors.count = m, e->lasts = 0;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_RANGE);
    e->lasts = 1, e->count = 0;
    CHECK(R__(plan_tighten)(p, e, &x->goal, plan, NULL, 1, to, &tight) == ROLN_E_RANGE);
}

/* Statuses of plans with limits that make no sense. */
static void R_(refused)(void)
{
    enum { n = R__(n), m = R__(motors), H = R__(steps) };
    const roln_real nan = (roln_real)NAN, inf = (roln_real)INFINITY;
    static R__(params) p;
    static R_(task) x;
    static R__(plan) plan;
    static R__(evidence) e;
    static R__(plan_next_work) w;
    static R__(plan_tighten_work) tight;
    static ld M[H][4 * n * n], G[H][2 * n * n];
    roln_real to[H * R__(N)];
    uint64_t seed = 43;
    int what;
    R__(start_model)(&p);
    for (what = 0; what < 14; what++) {
        roln_real *const at[14] = {x.low, x.high, x.low, x.high, x.low, x.tighten + H, x.tighten, x.tighten,
                                   x.reserve, x.reserve + 1, x.reserve, x.low, x.high, x.reserve};
        const roln_real bad[14] = {nan, nan, inf, -inf, 1, -1, nan, inf, -1, 4, nan, -inf, inf, ROLN_C(3.9375)};
        const roln_status want[14] = {ROLN_E_NOT_FINITE, ROLN_E_NOT_FINITE, ROLN_E_NOT_FINITE, ROLN_E_NOT_FINITE, ROLN_E_RANGE,
                                      ROLN_E_RANGE, ROLN_E_NOT_FINITE, ROLN_E_NOT_FINITE, ROLN_E_RANGE, ROLN_E_RANGE,
                                      ROLN_E_NOT_FINITE, ROLN_OK, ROLN_OK, ROLN_OK};
        const R__(latent) s = {{0}, {0}};
        roln_status st;
        R_(place)(ROLN_OF_Z, &seed, &x);
        x.term[1].ref = NULL, x.term[1].tighten = x.tighten, x.goal.reserve = x.reserve;
        *at[what] = bad[what];
        memset(&plan, 0, sizeof plan);
        st = R__(plan_next)(&p, &x.goal, &s, &plan, &w);
        if (!CHECK(st == want[what] && plan.plan.valid == (st == ROLN_OK))) printf("    number %d: status %d\n", what, (int)st);
    }
    R_(place)(ROLN_OF_Z, &seed, &x);
    R_(known)(&p, &x, &plan, &e, M, G);
    CHECK_OK(R__(plan_tighten)(&p, &e, &x.goal, &plan, x.term + 1, 0, to, &tight));
    for (what = 0; what < H * n; what++)
        CHECK(to[what] >= 0 && to[what] <= 0);
    R_(tighten_refused)(&p, &x, &plan, &e);
}

static void R_(robust)(void)
{
    uint64_t seed = 30;
    int what, i;
    for (what = 0; what < 8; what++) {
        for (i = 0; i < 40; i++)
            R_(cost)(what, &seed);
        R_(nothing)(what);
    }
    for (what = 0; what <= 8; what++)
        R_(tightened)(what);
    R_(keeps)(0), R_(keeps)(1);
    R_(reserved)(0), R_(reserved)(1);
    R_(rates)();
    R_(inside)();
    R_(refused)();
}

#undef R_
#undef R__
