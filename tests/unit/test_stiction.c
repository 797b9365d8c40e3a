/* SPDX-License-Identifier: MIT */
/* Steps with stiction (roln_lnn_stick): against a twin that tries every set of coordinates that dry friction may hold; derivatives
   against differences; the search for that set; blocks that stand to the bit, slide and stop; energy, extremes, statuses. */
#include "roln_lnn.h"
#include "network.h"

void TEST_NAME(stiction)(void);

#define STEP_WORK(scheme, nb) ROLN_LNN_STICK_WORK(SZ, ROLN_LNN_STEP_WORK(SZ, scheme, 0, nb), nb)

/* ---- twin ---- */

enum { SLIDES_BACK, HELD, SLIDES, WAYS };

/* low [n], high [n] of the step from s that arrives at z_f without dry friction, with the terms of z_f in tt. */
static void t_bounds(ld h, const ld *s, ld *low, ld *high)
{
    const int n = m.f.n;
    int i;
    for (i = 0; i < n; i++) {
        const ld *law = m.th + friction_at + i, c = expl(law[0]);
        ld a = 0, more = 0;
        if (m.f.friction == -2) {
            const ld fall = coshl(s[n + i] / expl(law[3 * n]));
            a = tanhl(law[5 * n]), more = expl(law[2 * n]) / (fall * fall) + expl(law[4 * n]) * fabsl(tt.g[i]);
        }
        high[i] = h * (c * (1 + a) + more), low[i] = -h * (c * (1 - a) + more);
    }
}

/* lambda and v+ of the ways of each coordinate, with W = M^-1 of tt. Returns by how much the conditions are kept, the least of all
   coordinates. Below 0 one is missed. */
static ld t_try(const int *way, const ld *W, const ld *vf, const ld *low, const ld *high, ld *lambda, ld *v)
{
    const int n = m.f.n;
    ld A[MAXN * MAXN], kept = 1;
    int i, j;
    for (i = 0; i < n; i++) {
        const int held = way[i] == HELD;
        lambda[i] = held ? vf[i] : way[i] == SLIDES ? high[i] : low[i];
        for (j = 0; j < n; j++) A[i * n + j] = held ? W[i * n + j] : i == j;
    }
    t_solve(n, 1, A, lambda);
    for (i = 0; i < n; i++)
        for (v[i] = vf[i], j = 0; j < n; j++) v[i] -= W[i * n + j] * lambda[j];
    for (i = 0; i < n; i++) {
        const ld size = high[i] - low[i], by = way[i] == HELD ? ROLN_MIN(high[i] - lambda[i], lambda[i] - low[i]) / size
                                                              : (way[i] == SLIDES ? v[i] : -v[i]) / W[i * (n + 1)] / size;
        kept = ROLN_MIN(kept, by);
        if (way[i] == HELD) v[i] = 0;
    }
    return kept;
}

/* One step of one sample, and the way of each coordinate. Returns the distance from another set of ways. */
static ld t_stick(int scheme, ld h, const ld *s, ld *sn, int *way)
{
    const int n = m.f.n;
    ld W[MAXN * MAXN], sf[2 * MAXN], low[MAXN], high[MAXN], lambda[MAXN], v[MAXN], kept, best = -1e9L;
    int i, k, all = 1, of[MAXN];
    t_step(scheme, h, s, sf);
    t_terms(sf, sf + n);
    t_bounds(h, s, low, high);
    for (i = 0; i < n * n; i++) W[i] = i % (n + 1) == 0;
    t_solve(n, n, tt.M, W);
    for (i = 0; i < n; i++) all *= WAYS;
    for (k = 0; k < all; k++) {
        int rest = k;
        for (i = 0; i < n; i++, rest /= WAYS) of[i] = rest % WAYS;
        kept = t_try(of, W, sf + n, low, high, lambda, v);
        if (kept <= best) continue;
        best = kept;
        memcpy(way, of, sizeof of);
        for (i = 0; i < n; i++) {
            const ld lost = sf[n + i] - v[i];
            sn[n + i] = v[i];
            sn[i] = scheme == ROLN_EULER ? sf[i] : of[i] == HELD ? s[i] + h / 2 * s[n + i] : sf[i] - h / 2 * lost;
        }
    }
    CHECK(best >= -1e-12L);
    return best;
}

/* ---- steps ---- */

/* The shapes of these tests, at most three coordinates. */
enum { SHAPES = 12 };
static roln_lnn stick_shape(int i)
{
    switch (i) {
    case 0: return sticking(rubbing(shape(2, 0, 2, 3, 0)));
    case 1: return sticking(grinding(shape(2, 1, 2, 3, 0)));
    case 2: return sticking(rubbing(behind(shape(2, 0, 2, 3, 0), 1)));
    case 3: return sticking(grinding(cholesky(shape(3, 0, 2, 3, 0))));
    case 4: return sticking(rubbing(damped(turning(shape(2, 1, 2, 3, 0), 1))));
    case 5: return sticking(grinding(turning(dragged(shape(3, 0, 2, 3, 0)), 5)));
    case 6: return sticking(grinding(turning(behind(shape(3, 1, 2, 2, 0), 2), 3)));
    case 7: return sticking(rubbing(shape(1, 0, 3, 3, 2)));
    case 8: return sticking(grinding(damped(shape(1, 0, 2, 3, 0))));
    case 9: return sticking(rubbing(damped(cholesky(shape(3, 0, 2, 3, 0)))));
    case 10: return sticking(rubbing(shape(3, 1, 2, 3, 0)));
    default: return sticking(grinding(shape(3, 0, 3, 3, 2)));
    }
}

/* Random weights whose dry friction is of the size of the other forces, and a state in which some coordinates stand. */
static inputs stick_draw(const roln_lnn *f, int scheme, int nb, uint64_t *seed)
{
    roln_real *th = weights(f, seed);
    const int n = f->n;
    inputs x;
    int i;
    for (i = 0; i < n; i++) {
        th[friction_at + i] += ROLN_C(2.5) + roln_normal(seed);
        if (f->friction == -2) th[friction_at + 3 * n + i] -= 2, th[friction_at + 4 * n + i] -= 2;
    }
    widen(roln_lnn_params(f), th, m.th);
    x = draw(f, th, scheme, nb, 1, seed);
    if (scheme == ROLN_MIDPOINT) m.h /= 8; /* it settles */
    for (i = 0; i < nb * n; i++) {
        x.s[nb * n + i] = i % 2 == 0 || roln_uniform(seed) < ROLN_C(0.3) ? 0 : x.s[nb * n + i] / 4;
        m.s[nb * n + i] = (ld)x.s[nb * n + i];
    }
    return x;
}

/* How often coordinates stood, were held in motion and slid; and states with both held and sliding ones. */
static int stood, stopped, slid, mixed;

static void check_stick(roln_lnn f, int scheme, uint64_t *seed)
{
    const int n = f.n;
    const inputs x = stick_draw(&f, scheme, 1, seed);
    roln_real *sn = fresh(2 * n), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(STEP_WORK(scheme, 1));
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(&x, NULL, &sp, &fc);
    ld out[2 * MAXN], top, apart_by = 0;
    int way[MAXN], i, held = 0;
    const ld kept = t_stick(scheme, m.h, m.s, out, way);
    CHECK(roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)m.h, x.s, sn, tape, w) == ROLN_OK);
    top = largest(2 * n, m.s) + largest(2 * n, out) + 1;
    for (i = 0; i < 2 * n; i++) apart_by = ROLN_MAX(apart_by, fabsl((ld)sn[i] - out[i]));
    for (i = 0; i < n && kept > 1e-3L; i++) {
        CHECK((sn[n + i] == 0) == (way[i] == HELD));
        if (way[i] == HELD && x.s[n + i] == 0) CHECK(same(1, sn + i, x.s + i)), stood++;
        else if (way[i] == HELD) stopped++;
        else slid++;
        held += way[i] == HELD;
    }
    mixed += held > 0 && held < n;
    if (kept > 1e-3L) BOUND("stiction: step (eps)", apart_by / (top * EPS), 16);
    fresh_done();
}

static void test_steps(uint64_t *seed)
{
    int i, scheme, rep;
    for (rep = 0; rep < 12; rep++)
        for (i = 0; i < SHAPES; i++)
            for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) check_stick(stick_shape(i), scheme, seed);
    CHECK(stood > 50 && stopped > 20 && slid > 50 && mixed > 50);
}

/* A block of states is the states one by one; in place; sizes. */
static void test_block(uint64_t *seed)
{
    enum { NB = 4 };
    int i, r, scheme;
    for (i = 0; i < SHAPES; i++)
        for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) {
            const roln_lnn f = stick_shape(i);
            const int n = f.n;
            const inputs x = stick_draw(&f, scheme, NB, seed);
            roln_real *sn = fresh(2 * NB * n), *one = fresh(2 * n), *tape = fresh(TAPE(1, 0, NB));
            roln_real *w = fresh(STEP_WORK(scheme, NB));
            spring sp;
            roln_force fc;
            const roln_system sys = system_of(&x, NULL, &sp, &fc);
            const roln_real h = (roln_real)m.h;
            CHECK(roln_lnn_stick(&f, &sys, scheme, NB, h, x.s, sn, tape, w) == ROLN_OK);
            for (r = 0; r < NB; r++) {
                memcpy(one, x.s + r * n, (size_t)n * sizeof *one), memcpy(one + n, x.s + (NB + r) * n, (size_t)n * sizeof *one);
                CHECK(roln_lnn_stick(&f, &sys, scheme, 1, h, one, one, tape, w) == ROLN_OK);
                CHECK(same(n, one, sn + r * n) && same(n, one + n, sn + (NB + r) * n));
            }
            CHECK(roln_lnn_stick(&f, &sys, scheme, NB, h, x.s, sn, tape, room_of(STEP_WORK(scheme, NB))) == ROLN_OK);
            CHECK_ROOM();
            CHECK(roln_lnn_stick(&f, &sys, scheme, NB, h, x.s, sn, room_of(TAPE(1, 0, NB)), w) == ROLN_OK);
            CHECK_ROOM();
            fresh_done();
        }
}

/* ---- derivatives ---- */

static int jac_work(int scheme, int size)
{
    sz.step_1 = ROLN_LNN_STEP_WORK(SZ, scheme, 1, 1);
    return ROLN_LNN_STICK_JAC_WORK(SZ, ROLN_LNN_STEP_JAC_WORK(SZ, scheme, size));
}

/* Number j of the state and of the force. */
static roln_real *number(const inputs *x, int j)
{
    return j < 2 * m.f.n ? x->s + j : x->w + (j - 2 * m.f.n);
}

#ifdef ROLN_DOUBLE
/* The worst error of central differences of step d against J. */
static double check_slopes(const roln_lnn *f, const inputs *x, double d, const double *J)
{
    const int n2 = 2 * f->n;
    double *low = fresh(n2), *high = fresh(n2), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(STEP_WORK(m.kind, 1)), worst = 0;
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(x, NULL, &sp, &fc);
    int i, j;
    for (j = 0; j < 2 * n2; j++) {
        double *at = number(x, j), was = *at;
        *at = was - d;
        CHECK(roln_lnn_stick(f, &sys, m.kind, 1, (double)m.h, x->s, low, tape, w) == ROLN_OK);
        *at = was + d;
        CHECK(roln_lnn_stick(f, &sys, m.kind, 1, (double)m.h, x->s, high, tape, w) == ROLN_OK);
        *at = was;
        for (i = 0; i < n2; i++) worst = fmax(worst, fabs((high[i] - low[i]) / (2 * d) - J[j * n2 + i]));
    }
    return worst;
}
static int slopes_held, slopes_slid;
#endif

static void check_stick_jac(roln_lnn f, int scheme, uint64_t *seed)
{
    const int n = f.n, n2 = 2 * n;
    const inputs x = stick_draw(&f, scheme, 1, seed);
    const roln_real h = (roln_real)m.h;
    const int tapes = ROLN_JAC_TAPES(scheme) * TAPE(1, 1, 1);
    roln_real *J = fresh(2 * n2 * n2), *J0 = fresh(n2 * n2), *sn = fresh(n2), *to = fresh(n2), *tape = fresh(tapes);
    roln_real *w = fresh(jac_work(scheme, n2)), *once = fresh(TAPE(1, 0, 1)), *step = fresh(STEP_WORK(scheme, 1));
    spring sp;
    roln_force fc;
    const roln_system sys = system_of(&x, NULL, &sp, &fc);
    ld out[2 * MAXN];
    int way[MAXN], i, j;
    const ld kept = t_stick(scheme, m.h, m.s, out, way);
    CHECK(roln_lnn_stick(&f, &sys, scheme, 1, h, x.s, sn, once, step) == ROLN_OK);
    CHECK(roln_lnn_stick_jac(&f, &sys, scheme, n2, h, x.s, to, J, tape, w) == ROLN_OK);
    CHECK(same(n2, sn, to));
    memcpy(to, x.s, sizeof *to * (size_t)n2);
    CHECK(roln_lnn_stick_jac(&f, &sys, scheme, 0, h, to, to, J0, tape, w) == ROLN_OK);
    CHECK(same(n2, sn, to) && same(n2 * n2, J0, J));
    CHECK(roln_lnn_stick_jac(&f, &sys, scheme, n2, h, x.s, to, J, tape, room_of(jac_work(scheme, n2))) == ROLN_OK);
    CHECK_ROOM();
    CHECK(roln_lnn_stick_jac(&f, &sys, scheme, n2, h, x.s, to, J, room_of(tapes), w) == ROLN_OK);
    CHECK_ROOM();
    for (i = 0; i < n; i++)
        for (j = 0; j < 2 * n2 && sn[n + i] == 0; j++) {
            CHECK(J[j * n2 + n + i] == 0);
            if (scheme != ROLN_EULER) CHECK(J[j * n2 + i] == (j == i ? 1 : j == n + i ? h / 2 : 0));
        }
#ifdef ROLN_DOUBLE
    if (kept > 0.05L) {
        /* nothing that is held begins to slide within d; the step of the midpoint rule is an eighth */
        const double d = 1e-3 * (kept < 0.5L ? 2 * (double)kept : 1) / (scheme == ROLN_MIDPOINT ? 8 : 1);
        const double e = check_slopes(&f, &x, d, J), half = check_slopes(&f, &x, d / 2, J);
        ld top = 0;
        for (i = 0; i < 2 * n2 * n2; i++) top = ROLN_MAX(top, fabsl((ld)J[i]));
        for (i = 0; i < n; i++) slopes_held += way[i] == HELD, slopes_slid += way[i] != HELD;
        BOUND("stiction: slopes of differences", (ld)half / top, 1e-5L);
        if (e > 1e-9 && f.damping < 2) CHECK_NEAR(e / half, 4, 0.2); /* |y| of drag has a kink at rest */
    }
#else
    (void)kept, (void)number;
#endif
    fresh_done();
}

static void test_slopes(uint64_t *seed)
{
    int i, scheme, rep;
    for (rep = 0; rep < 6; rep++)
        for (i = 0; i < SHAPES; i++)
            for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) check_stick_jac(stick_shape(i), scheme, seed);
#ifdef ROLN_DOUBLE
    CHECK(slopes_held > 50 && slopes_slid > 50);
#endif
}

/* ---- the search ---- */

/* A random W [n][n] whose eigenvalues spread by e^spread, as deviation of their logarithm. */
static void random_metric(int n, double spread, roln_real *W, uint64_t *seed)
{
    ld Q[8 * 8], l[8], s;
    int i, j, k;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) Q[i * n + j] = (ld)roln_normal(seed);
        for (j = 0; j < i; j++) {
            for (s = 0, k = 0; k < n; k++) s += Q[i * n + k] * Q[j * n + k];
            for (k = 0; k < n; k++) Q[i * n + k] -= s * Q[j * n + k];
        }
        for (s = 0, k = 0; k < n; k++) s += Q[i * n + k] * Q[i * n + k];
        for (k = 0; k < n; k++) Q[i * n + k] /= sqrtl(s);
        l[i] = expl((ld)spread * (ld)roln_normal(seed));
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            for (s = 0, k = 0; k < n; k++) s += l[k] * Q[k * n + i] * Q[k * n + j];
            W[i * n + j] = (roln_real)s;
        }
}

/* The impulse keeps its bounds and the conditions of each coordinate, and takes kinetic energy. No level is an impulse of 0. */
static void test_search(uint64_t *seed)
{
    static const roln_real bad[4] = {1, 2, 2, 1}, one[2] = {1, 1}, low2[2] = {-9, -9}, high2[2] = {9, 9};
    roln_real x[2], A2[4], mu2[2];
    int rep, i, j, held = 0;
    for (rep = 0; rep < 4000; rep++) {
        const int n = 1 + rep % 8, none = rep % 50 == 0;
        roln_real *W = fresh(n * n), *low = fresh(n), *high = fresh(n), *lambda = fresh(n), *A = fresh(n * n), *mu = fresh(n);
        roln_real *v = fresh(n), *push = normal(n, 2, seed);
        ld gain = 0;
        random_metric(n, rep % 7 * (EPS > 1e-10L ? 0.25 : 1) / 2, W, seed);
        for (i = 0; i < n; i++) {
            high[i] = none ? 0 : ROLN_ABS(roln_normal(seed)), low[i] = none ? 0 : -ROLN_ABS(roln_normal(seed));
            v[i] = roln_dot(n, W + i * n, push);
        }
        CHECK(rolni_stick_impulse(n, W, v, low, high, lambda, A, mu) == ROLN_OK);
        for (i = 0; i < n; i++) {
            ld now = (ld)v[i], size = fabsl(now), off;
            for (j = 0; j < n; j++) {
                const ld part = (ld)W[i * n + j] * (ld)lambda[j];
                now -= part, size += fabsl(part), gain += (ld)lambda[i] * part / 2;
            }
            gain -= (ld)lambda[i] * (ld)v[i];
            CHECK(low[i] <= lambda[i] && lambda[i] <= high[i] && (!none || lambda[i] == 0));
            if (none) continue;
            off = low[i] < lambda[i] && lambda[i] < high[i] ? fabsl(now) : lambda[i] > 0 ? -now : now;
            held += low[i] < lambda[i] && lambda[i] < high[i];
            BOUND("stiction: conditions (eps)", off / (size * EPS), 4);
        }
        CHECK(none ? gain >= 0 && gain <= 0 : gain < 0);
        fresh_done();
    }
    CHECK(held > 1000);
    CHECK(rolni_stick_impulse(2, bad, one, low2, high2, x, A2, mu2) == ROLN_E_NOT_SPD);
}

/* ---- motion ---- */

/* A block on a plane, V = slope z and M = e^mass in any place; law: numbers of friction. */
static roln_real *block_on(const roln_lnn *f, double mass, double slope, const double *law, uint64_t *seed)
{
    roln_real *th = weights(f, seed);
    int i;
    for (i = 0; i < friction_at; i++) th[i] = 0;
    th[6] = (roln_real)mass;                              /* bias of u */
    th[7] = 1, th[9] = 60, th[11] = (roln_real)slope;     /* slope softplus(z + 60) */
    for (i = 0; i < base_at - friction_at; i++) th[friction_at + i] = (roln_real)law[i];
    return th;
}

/* Below the limit of the level, forward and backward, it stands to the bit. Above it slides with the acceleration that is left. */
static void check_incline(int kind, int scheme, int steps, uint64_t *seed)
{
    static const double law[6] = {-0.5, -4, -1.5, -2, -2.5, 0.3};
    static const double part[4] = {0.999, -0.999, 1.5, -1.5};
    const roln_lnn f = sticking(kind == 1 ? rubbing(shape(1, 0, 2, 2, 0)) : grinding(shape(1, 0, 2, 2, 0)));
    const double c = exp(law[0]), a = tanh(law[5]), slope = 0.75, mass = exp(0.4), h = 0.0078125;
    roln_real *th = block_on(&f, 0.4, slope, law, seed), *s = fresh(2), *tape = fresh(TAPE(1, 0, 1));
    roln_real *w = fresh(STEP_WORK(scheme, 1)), tau;
    roln_force fc;
    roln_system sys;
    int q, k;
    fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = &tau, fc.jac_zd = NULL;
    sys.theta = th, sys.force = &fc;
    for (q = 0; q < 4; q++) {
        const double more = kind == 1 ? 0 : exp(law[2]) + exp(law[4]) * slope, way = part[q] < 0 ? -1 : 1;
        const double level = c * (kind == 1 ? 1 : 1 + way * a) + more, force = part[q] * level;
        const roln_real start = ROLN_C(0.3);
        tau = (roln_real)(force + slope), s[0] = start, s[1] = 0;
        if (q < 2) {
            for (k = 0; k < steps; k++) CHECK(roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
            CHECK(same(1, s, &start) && s[1] == 0);
        } else if (kind == 1) {
            const double acc = (force - way * level) / mass, t = 64 * h;
            for (k = 0; k < 64; k++) CHECK(roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
            BOUND("incline: velocity (eps)", fabsl((ld)s[1] - (ld)(acc * t)) / ((ld)fabs(acc * t) * EPS), 60);
            if (scheme == ROLN_EULER) continue;
            BOUND("incline: position (eps)", fabsl((ld)s[0] - 0.3L - (ld)(acc * t * t / 2)) / EPS, 20);
        } else {
            CHECK(roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
            BOUND("incline: it slides (eps)", fabsl((ld)s[1] - (ld)(h * (force - way * level) / mass)) / EPS, 8);
        }
    }
    fresh_done();
}

static void test_incline(uint64_t *seed)
{
    int kind, scheme;
    for (kind = 1; kind <= 2; kind++)
        for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++)
            check_incline(kind, scheme, scheme == ROLN_RK4 ? 100000 : 1000, seed);
}

/* A block on the level stops where Coulomb's law stops it, and stands there. */
static void test_stop(uint64_t *seed)
{
    static const double law[2] = {-1, -4};
    const roln_lnn f = sticking(rubbing(shape(1, 0, 2, 2, 0)));
    const double c = exp(-1), h = 0.01, mass = exp(0.4), start = 0.9;
    roln_real *th = block_on(&f, 0.4, 0, law, seed), *s = fresh(2), *last, *tape = fresh(TAPE(1, 0, 1));
    roln_real *w = fresh(STEP_WORK(ROLN_RK4, 1));
    const roln_system sys = {th, NULL};
    const int steps = (int)(start * mass / c / h);
    int k;
    s[0] = 0, s[1] = (roln_real)start;
    for (k = 0; k < steps; k++) {
        CHECK(roln_lnn_stick(&f, &sys, ROLN_RK4, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
        CHECK(s[1] > 0);
    }
    CHECK(roln_lnn_stick(&f, &sys, ROLN_RK4, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
    last = copy(2, s);
    CHECK(s[1] == 0);
    CHECK_NEAR(s[0], start * start * mass / (2 * c), c / mass * h * h);
    for (k = 0; k < 100; k++) CHECK(roln_lnn_stick(&f, &sys, ROLN_RK4, 1, (roln_real)h, s, s, tape, w) == ROLN_OK);
    CHECK(same(2, s, last));
    fresh_done();
}

/* In a bowl without torque the energy never grows, but by the error of the step, h^3, and everything comes to stand to the bit. The
   impulse itself takes kinetic energy: an Euler step with it and without it end in the same place. */
static void test_energy(uint64_t *seed)
{
    int which, k, i;
    for (which = 0; which < 6; which++) {
        const roln_lnn f = sticking(which % 2 ? grinding(shape(2, 0, 2, 4, 0)) : rubbing(damped(shape(2, which == 4, 2, 4, 0))));
        roln_real *th = bowl(&f, seed), *s = fresh(4), *to = fresh(4), *last, *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
        roln_real *ws = fresh(STEP_WORK(ROLN_MIDPOINT, 1)), *wf = fresh(STEP_WORK(ROLN_EULER, 1));
        const roln_system sys = {th, NULL};
        double e, now, rise = 0, taken = 0;
        for (i = 0; i < 2; i++) {
            th[friction_at + i] = ROLN_C(-2.5);
            if (which % 2) th[friction_at + 4 + i] = -3, th[friction_at + 6 + i] = -1, th[friction_at + 8 + i] = -3;
        }
        s[0] = ROLN_C(0.6), s[1] = ROLN_C(-0.3), s[2] = ROLN_C(0.2), s[3] = ROLN_C(0.5);
        e = energy(&f, th, s, tape, w);
        for (k = 0; k < 4000; k++) {
            double before;
            CHECK(roln_lnn_step(&f, &sys, ROLN_EULER, 0, 1, ROLN_C(0.01), s, to, tape, w) == ROLN_OK);
            before = energy(&f, th, to, tape, w);
            CHECK(roln_lnn_stick(&f, &sys, ROLN_EULER, 1, ROLN_C(0.01), s, to, tape, wf) == ROLN_OK);
            taken = fmax(taken, energy(&f, th, to, tape, w) - before);
            CHECK(roln_lnn_stick(&f, &sys, ROLN_MIDPOINT, 1, ROLN_C(0.01), s, s, tape, ws) == ROLN_OK);
            now = energy(&f, th, s, tape, w);
            rise = fmax(rise, now - e), e = now;
        }
        BOUND("stiction: rise of the energy in a step", (ld)rise, 8e-6L);
        BOUND("stiction: energy that an impulse adds (eps)", (ld)taken / EPS, 2);
        last = copy(4, s);
        CHECK(s[2] == 0 && s[3] == 0);
        CHECK(roln_lnn_stick(&f, &sys, ROLN_MIDPOINT, 1, ROLN_C(0.01), s, s, tape, ws) == ROLN_OK);
        CHECK(same(4, s, last));
        fresh_done();
    }
}

/* ---- extremes ---- */

/* The statuses of a step and of its derivatives are st, and nothing is written. */
static void refused(const roln_lnn *f, const roln_real *th, int scheme, roln_real h, const roln_real *s, roln_status st)
{
    const int n2 = 2 * f->n;
    roln_real *sn = zeros(n2), *before = zeros(n2), *J = fresh(n2 * n2), *w = fresh(jac_work(scheme, 0));
    roln_real *tape = fresh(ROLN_JAC_TAPES(scheme) * TAPE(1, 1, 1)), *ws = fresh(STEP_WORK(scheme, 1));
    const roln_system sys = {th, NULL};
    CHECK(roln_lnn_stick(f, &sys, scheme, 1, h, s, sn, tape, ws) == st && same(n2, sn, before));
    CHECK(roln_lnn_stick_jac(f, &sys, scheme, 0, h, s, sn, J, tape, w) == st && same(n2, sn, before));
}

static void test_refused(uint64_t *seed)
{
    static const double law[6] = {-0.5, -4, -1.5, -2, -2.5, 0.3}, endless[6] = {1e4, -4, -1.5, -2, -2.5, 0.3};
    const roln_real tiny = (roln_real)PICK(1e-36, 1e-300);
    const roln_lnn f = sticking(grinding(shape(1, 0, 2, 2, 0))), based = sticking(rubbing(shape(1, 1, 2, 2, 0)));
    const roln_real rest[2] = {0, 0}, fast[2] = {0, 1000};
    roln_real *th = block_on(&f, 0.4, 0.75, law, seed);
    refused(&f, th, ROLN_RK4, ROLN_C(-0.01), rest, ROLN_E_RANGE);
    th[0] = 1, th[4] = 1; /* u = softplus(z) + .. */
    refused(&f, th, ROLN_EULER, 1, fast, ROLN_E_RANGE); /* where the step ends there is no M */
    th = block_on(&f, 0.4, 0.75, endless, seed);
    refused(&f, th, ROLN_RK4, ROLN_C(0.01), rest, ROLN_E_NOT_FINITE);
    th = block_on(&based, 0.4, 0, law, seed);
    th[base_at] = -1;
    refused(&based, th, ROLN_RK4, ROLN_C(0.01), rest, ROLN_E_NOT_SPD);
    th[base_at] = tiny, th[6] = -39 * tiny; /* M = e^-39 tiny: its inverse is no number */
    refused(&based, th, ROLN_RK4, ROLN_C(0.01), rest, ROLN_E_NOT_FINITE);
    fresh_done();
}

/* A mass matrix next to singular has a Cholesky factor where rounding leaves its inverse none. Both coordinates are held. */
static void test_singular(uint64_t *seed)
{
    int k, good = 0, bad = 0;
    for (k = 1; k < 200; k++) {
        roln_lnn f = sticking(rubbing(cholesky(shape(2, 0, 2, 2, 0))));
        const roln_real rest[4] = {0, 0, 0, 0};
        roln_real *th, *sn = zeros(4), *before = zeros(4), *tape, *w;
        roln_system sys = {NULL, NULL};
        roln_status st;
        int i;
        f.eigenvalue_floor = (roln_real)1e-30;
        th = weights(&f, seed), tape = fresh(TAPE(1, 0, 1)), w = fresh(STEP_WORK(ROLN_EULER, 1));
        for (i = 0; i < base_at; i++) th[i] = 0;
        i = roln_mlp_params(&f.mass_net) - ROLN_TRI(2); /* L = [1 0; 1 r], and levels of 1 */
        th[i] = th[i + 2] = 1, th[i + 1] = ROLN_SQRT(ROLN_C(0.25) * (roln_real)k * ROLN_EPS);
        sys.theta = th;
        st = roln_lnn_stick(&f, &sys, ROLN_EULER, 1, ROLN_C(0.01), rest, sn, tape, w);
        CHECK((st == ROLN_OK || st == ROLN_E_NOT_SPD) && same(4, sn, before));
        good += st == ROLN_OK, bad += roln_lnn_zdd(&f, 0, 1, th, rest, NULL, sn, tape, w) == ROLN_OK && st != ROLN_OK;
        fresh_done();
    }
    CHECK(good > 0 && (bad > 0 || EPS > 1e-10L)); /* as float none of these is refused */
}

/* Without a level it is the step, to the bit. Huge numbers make numbers or a status. */
static void test_extremes(uint64_t *seed)
{
    int i, scheme, rep, good = 0, bad = 0;
    for (i = 0; i < SHAPES; i++)
        for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++) {
            const roln_lnn f = stick_shape(i);
            const int n2 = 2 * f.n;
            inputs x = stick_draw(&f, scheme, 1, seed);
            roln_real *sn = fresh(n2), *to = fresh(n2), *tape = fresh(TAPE(1, 0, 1)), *w = fresh(STEP_WORK(scheme, 1)), *was;
            const roln_system sys = {x.th, NULL};
            int j;
            was = copy(base_at - friction_at, x.th + friction_at);
            for (j = 0; j < f.n; j++)
                for (rep = 0; rep < 6; rep += 2)
                    if (rep == 0 || f.friction == -2) x.th[friction_at + rep * f.n + j] = ROLN_C(-1e4);
            CHECK(roln_lnn_step(&f, &sys, scheme, 0, 1, (roln_real)m.h, x.s, sn, tape, w) == ROLN_OK);
            CHECK(roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)m.h, x.s, to, tape, w) == ROLN_OK);
            CHECK(same(n2, sn, to));
            memcpy(x.th + friction_at, was, sizeof *was * (size_t)(base_at - friction_at));
            for (rep = 0; rep < 40; rep++) {
                const double power = EPS > 1e-10L ? 38 : 308;
                roln_real *big = copy(n2, x.s), *before = copy(n2, to);
                big[rep % n2] = (roln_real)(pow(10, power * (rep % 9) / 8) * (rep % 2 ? -1 : 1));
                x.th[friction_at + rep % f.n] = rep % 3 ? was[rep % f.n] : (roln_real)(power * 2);
                if (roln_lnn_stick(&f, &sys, scheme, 1, (roln_real)m.h, big, to, tape, w) == ROLN_OK)
                    CHECK(roln_all_finite(n2, to)), good++;
                else CHECK(same(n2, to, before)), bad++;
            }
            fresh_done();
        }
    CHECK(good > 100 && bad > 100);
}

void TEST_NAME(stiction)(void)
{
    uint64_t seed = 11;
    test_steps(&seed);
    test_block(&seed);
    test_slopes(&seed);
    test_search(&seed);
    test_incline(&seed);
    test_stop(&seed);
    test_energy(&seed);
    test_refused(&seed);
    test_singular(&seed);
    test_extremes(&seed);
    print_bounds();
}
