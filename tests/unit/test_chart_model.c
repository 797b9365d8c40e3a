/* SPDX-License-Identifier: MIT */
/* Charts of a model (roln.h; the fit itself: test_chart.c): steps of the encoder, NAME_chart_refine, to the encoder of a known
   manifold; NAME_chart_center, _add, _merge, _solve are the functions of roln_ae.h in the units of the user; a fleet of
   machines. */
#define CALLED(X) X(encode) X(fit_range)
#include "small.h"
#include "charts.h"

void TEST_NAME(chart_model)(void);

/* ---- the encoder -------------------------------------------------------------------------------- */



/* A model with its samples, q = scale.q phi(z), and what has to be kept of the steps of its encoder. */
static struct {
    int k;
    roln_real theta[MAXP], q[MAX_SAMPLES * 8], qd[MAX_SAMPLES * 8], zd_max[8];
    roln_batch b;
    roln_lbfgs state;
    roln_real psi[64], from[16], keep[ROLN_LBFGS_KEEP(ROLN_REFINE_PAIRS, 64)];
} enc;

/* A step. The rest of NAME_refinement is scratch: new in every step, and as large as it must be. */
#define TURN(of) \
    static roln_status turn_##of(roln_real *left) \
    { \
        static of##_refinement t; \
        static of##_params p; \
        roln_status st; \
        p.slope = of##_model.ae.slope, p.eigenvalue_floor = of##_model.lnn.eigenvalue_floor, p.scale = scale; \
        memcpy(p.theta, enc.theta, sizeof p.theta), memcpy(p.zd_max, enc.zd_max, sizeof p.zd_max); \
        memset(&t, 0x5b, sizeof t); \
        t.state = enc.state, memcpy(t.psi, enc.psi, sizeof t.psi), memcpy(t.from, enc.from, sizeof t.from); \
        memcpy(t.keep, enc.keep, sizeof t.keep); \
        st = of##_chart_refine(&p, &enc.b, &t, left); \
        enc.state = t.state, memcpy(enc.psi, t.psi, sizeof t.psi), memcpy(enc.from, t.from, sizeof t.from); \
        memcpy(enc.keep, t.keep, sizeof t.keep); \
        memcpy(enc.theta, p.theta, sizeof p.theta), memcpy(enc.zd_max, p.zd_max, sizeof p.zd_max); \
        if (st == ROLN_OK && enc.b.count >= ROLN_CHART_BLOCK) CHECK_WRITTEN(t.room), CHECK_WRITTEN(t.encoder); \
        return st; \
    }

/* All bytes of an array, or a structure, are written but those of a number or two at its end. */
#define CHECK_WRITTEN(x) CHECK_BELOW(untouched((int)sizeof(x), (const unsigned char *)(const void *)&(x)), 2 * sizeof(double))
static int untouched(int size, const unsigned char *bytes)
{
    int i = size;
    while (i > 0 && bytes[i - 1] == 0x5b)
        i--;
    return size - i;
}

TURN(chart)
TURN(curved)

static roln_status turn(roln_real *left)
{
    return enc.k == CHART ? turn_chart(left) : turn_curved(left);
}

/* Steps until there is none, or so many; the residual never grows. The last status. */
static roln_status turns(int most, roln_real *left)
{
    roln_status st = ROLN_OK;
    roln_real before = 1e30f;
    int k;
    for (k = 0; k < most && st == ROLN_OK; k++) {
        st = turn(left);
        if (st == ROLN_OK) CHECK(*left <= before), before = *left;
    }
    return st;
}

/* count samples, with noise, of a chart with random weights, W times `curved`; truth [ae_size] out. */
static void motion(int k, int count, roln_real curved, double noise, roln_real *truth, uint64_t *s)
{
    roln_real *th, *w;
    int i;
    memset(&enc, 0, sizeof enc);
    enc.k = k;
    take(&models[k]->md->ae);
    dyadic(models[k]->params, ROLN_C(0.5), s, enc.theta);
    th = weights_of(1, s), w = th + of.ae_size - of.monomials * of.bent;
    for (i = 0; i < of.monomials * of.bent; i++) w[i] *= curved;
    manifold(th, count, noise, s);
    memcpy(enc.theta, th, (size_t)of.ae_size * sizeof *th), memcpy(truth, th, (size_t)of.ae_size * sizeof *th);
    CHECK(count * of.N <= (int)(sizeof enc.q / sizeof *enc.q));
    for (i = 0; i < count * of.N; i++) enc.q[i] = scale.q * samples[i], enc.qd[i] = roln_normal(s);
    enc.b.count = count, enc.b.stride = 1, enc.b.q = enc.q, enc.b.qd = enc.qd;
    fresh_done();
}

/* How far the rows of Psi^T are from the space that those of enc.psi span. */
static ld astray(const roln_real *psi)
{
    ld worst = 0;
    int i, j, k;
    for (i = 0; i < of.n; i++) {
        ld row[16], size = 0, rest = 0;
        for (k = 0; k < of.bent; k++) row[k] = (ld)psi[i * of.bent + k], size += row[k] * row[k];
        for (j = 0; j < of.n; j++) {
            ld dot = 0;
            for (k = 0; k < of.bent; k++) dot += (ld)psi[i * of.bent + k] * (ld)enc.psi[j * of.bent + k];
            for (k = 0; k < of.bent; k++) row[k] -= dot * (ld)enc.psi[j * of.bent + k];
        }
        for (k = 0; k < of.bent; k++) rest += row[k] * row[k];
        worst = rest > worst * worst * size ? sqrtl(rest / size) : worst;
    }
    return worst;
}

/* Modes: over the samples neither z nor zd are correlated, and zd / z grows from one to the next. */
static void check_modes(const instance *m)
{
    ld mean[8] = {0}, zz[64] = {0}, dd[64] = {0}, before = 0;
    roln_real z[8], zd[8];
    int k, i, j;
    for (k = 0; k < enc.b.count; k++) {
        const int at = enc.b.start ? enc.b.start[k] : k;
        CHECK_OK(m->of->encode(m, enc.q + at * of.N, enc.qd + at * of.N, z, zd, spare));
        for (i = 0; i < of.n; i++)
            for (mean[i] += (ld)z[i] / enc.b.count, j = 0; j < of.n; j++) {
                zz[i * of.n + j] += (ld)z[i] * (ld)z[j] / enc.b.count;
                dd[i * of.n + j] += (ld)zd[i] * (ld)zd[j] / enc.b.count;
            }
    }
    for (i = 0; i < of.n; i++)
        for (j = 0; j < of.n; j++) zz[i * of.n + j] -= mean[i] * mean[j];
    for (i = 0; i < of.n; i++) {
        const ld rate = dd[i * of.n + i] / zz[i * of.n + i];
        CHECK(rate >= before);
        before = rate;
        for (j = 0; j < i; j++) {
            const int at = i * of.n + j, one = i * (of.n + 1), two = j * (of.n + 1);
            BOUND("encoder: positions correlated (eps)", fabsl(zz[at]) / sqrtl(zz[one] * zz[two]) / EPS, 200);
            BOUND("encoder: velocities correlated (eps)", fabsl(dd[at]) / sqrtl(dd[one] * dd[two]) / EPS, 200);
        }
    }
}

/* What a step leaves: a left inverse, modes, samples in [-1, 1], the largest |zd|, the closed form for these samples. */
static void check_turned(roln_real left)
{
    const instance m = trained(models[enc.k], &scale, enc.theta);
    const int count = enc.b.count, size = size_of_sums();
    roln_real low[8], high[8], top[8], again = 7, *th = copy(of.ae_size, enc.theta), *z = fresh(50 * of.n), *x = fresh(50 * of.N);
    roln_real *back = fresh(50 * of.n), *w = th + of.ae_size - of.monomials * of.bent;
    uint64_t s = 5;
    ld terms = 0;
    int i;
    CHECK_OK(roln_ae_check(&ae, enc.theta));
    check_modes(&m);
    CHECK_OK(m.of->fit_range(&m, count, enc.q, enc.qd, low, high, top, spare));
    for (i = 0; i < of.n; i++) {
        CHECK_NEAR(low[i], -1, 300 * EPS), CHECK_NEAR(high[i], 1, 300 * EPS);
        CHECK_NEAR(top[i], enc.zd_max[i], 30 * EPS * (ld)top[i]);
    }
    states(50, &s, z);
    decode(enc.theta, 50, z, x), encode(enc.theta, 50, x, back);
    for (i = 0; i < of.n * of.bent; i++) terms += fabsl((ld)layer_of(enc.theta)[of.n * of.bent + i]);
    BOUND("encoder: left inverse (eps of terms)", furthest(50 * of.n, back, z) / (terms * (1 + largest(50 * of.N, x)) * EPS), 5);
    for (i = 0; i < count * of.N; i++) samples[i] = enc.q[i] / scale.q;
    clear(sums);
    CHECK_OK(add(th, count, samples, sums));
    CHECK_OK(solve(sums, ROLN_CHART_RIDGE, th, &again));
    decode(th, 50, back, x), decode(enc.theta, 50, back, spare + 10000);
    BOUND("encoder: the closed form again (eps)", apart(50 * of.N, spare + 10000, x) / EPS, PICK(100, 1e5L));
    again = again * again + ROLN_CHART_RIDGE * roln_dot(of.monomials * of.bent, w, w) * (roln_real)sums[0] /
                                (roln_real)rolni_chart_spread(1 + of.n + of.monomials, of.bent, sums);
    CHECK_NEAR(ROLN_SQRT(again), left, PICK(1e-3L, 1e-7L) * (ld)left + PICK(2e-7, 1e-7));
    CHECK(size > 0);
    fresh_done();
}

/* The gradient that a step leaves is that of log sqrt(sum |v - C^T f|^2) at enc.psi, but for the ridge. */
static void check_slope(void)
{
    enum { COUNT = 300 };
    static ld v[COUNT * T_WIDTH], psi[64];
    const int size = of.n * of.bent;
    const roln_real *layer = layer_of(enc.theta), *in;
    roln_real *z = fresh(COUNT * of.n);
    ld largest_g = 0, worst = 0;
    int i;
    CHECK(enc.b.count == COUNT);
    for (i = 0; i < COUNT * of.N; i++) samples[i] = enc.q[i] / scale.q;
    in = rolni_chart_encode(&ae, enc.theta, COUNT, samples, 1, NULL, z, spare);
    for (i = 0; i < COUNT * of.bent; i++) v[i] = (ld)in[i] + (ld)layer[2 * size + i % of.bent];
    widen(size, enc.psi, psi);
    for (i = 0; i < size; i++) {
        const ld was = psi[i], h = 1e-4L;
        ld up, down, off;
        psi[i] = was + h, up = t_left(layer, COUNT, v, psi);
        psi[i] = was - h, down = t_left(layer, COUNT, v, psi);
        psi[i] = was;
        off = fabsl(logl(up / down) / (4 * h) - (ld)enc.keep[i]);
        worst = off > worst ? off : worst;
        largest_g = fabsl((ld)enc.keep[i]) > largest_g ? fabsl((ld)enc.keep[i]) : largest_g;
    }
    BOUND("encoder: gradient of the logarithm", worst / largest_g, PICK(3e-3L, 1e-3L));
    fresh_done();
}

/* A polynomial manifold without noise: from the principal directions, and from an encoder that is off, to its own encoder. What is
   left is the ridge's. */
static void check_turns(int k, int pod, uint64_t *s)
{
    static roln_real truth[MAXP];
    roln_real left = 7, first = 7, *psi;
    roln_status st;
    ld off;
    int i;
    motion(k, 400, pod ? ROLN_C(0.3) : 1, 0, truth, s);
    psi = layer_of(enc.theta) + of.n * of.bent;
    if (pod) CHECK_OK(roln_ae_init_pod(&ae, 400, enc.q, 1 / scale.q, NULL, enc.theta, area, fresh(ROLN_AE_POD_WORK(OF))));
    for (i = 0; i < of.n * of.bent && !pod; i++) psi[i] += ROLN_C(0.2) * roln_normal(s);
    fresh_done();
    CHECK_OK(turns(1, &first));
    check_turned(first);
    st = turns(400, &left);
    CHECK(st == ROLN_E_NO_CONVERGENCE || st == PICK(ROLN_E_NO_CONVERGENCE, ROLN_OK)); /* double goes on below what matters */
    check_turned(left);
    off = astray(layer_of(truth) + of.n * of.bent);
    BOUND("encoder: to that of the samples", off, PICK(5e-3L, 5e-4L));
    BOUND("encoder: what is left of a polynomial manifold", left, 2e-3L);
    CHECK(left < first / 3);
}

/* Where the start cannot be bettered the first call fits it, in modes, and the next one says that it is the end. */
static void check_good_start(int k, uint64_t *s)
{
    static roln_real truth[MAXP], kept[MAXP];
    roln_real left = 7;
    motion(k, 300, 0, 0, truth, s);
    CHECK_OK(roln_ae_init_pod(&ae, 300, enc.q, 1 / scale.q, NULL, enc.theta, area, fresh(ROLN_AE_POD_WORK(OF))));
    fresh_done();
    CHECK_OK(turn(&left));
    CHECK(turns(40, &left) == ROLN_E_NO_CONVERGENCE);
    check_turned(left);
    BOUND("encoder: what is left of a flat manifold", left, PICK(1e-4L, 1e-6L));
    memcpy(kept, enc.theta, sizeof kept);
    left = 7;
    CHECK(turn(&left) == ROLN_E_NO_CONVERGENCE && same(of.ae_size, kept, enc.theta) && all(1, &left, 7));
}

/* With noise. Stopped and gone on with from a copy, other scratch: the same bits. Picked from among others: the same bits. */
static void check_resumed(int k, uint64_t *s)
{
    enum { COUNT = 300 };
    static roln_real truth[MAXP], theta[MAXP], kept[sizeof enc.keep / sizeof *enc.keep], psi[64];
    static int start[COUNT];
    roln_real left[2] = {7, 7}, middle, *psi_at, *q, *qd;
    roln_lbfgs state;
    roln_status st;
    int i, round;
    motion(k, COUNT, 1, 0.02, truth, s);
    psi_at = layer_of(enc.theta) + of.n * of.bent;
    for (i = 0; i < of.n * of.bent; i++) psi_at[i] += ROLN_C(0.2) * roln_normal(s);
    memcpy(truth, enc.theta, sizeof truth);
    CHECK_OK(turns(1, left));
    check_slope();
    CHECK_OK(turns(2, left));
    middle = left[0];
    memcpy(theta, enc.theta, sizeof theta), memcpy(kept, enc.keep, sizeof kept), memcpy(psi, enc.psi, sizeof psi);
    state = enc.state;
    st = turns(3, left);
    check_turned(left[0]);
    for (round = 0; round < 2; round++) {
        const roln_real *end = copy(of.ae_size, enc.theta);
        if (round == 0) { /* from the middle */
            memcpy(enc.theta, theta, sizeof theta), memcpy(enc.keep, kept, sizeof kept), memcpy(enc.psi, psi, sizeof psi);
            enc.state = state, left[1] = middle;
        } else { /* from the start, every third sample of others, backwards */
            q = copy(COUNT * of.N, enc.q), qd = copy(COUNT * of.N, enc.qd);
            for (i = 0; i < COUNT; i++) {
                memcpy(enc.q + 3 * (COUNT - 1 - i) * of.N, q + i * of.N, (size_t)of.N * sizeof *q);
                memcpy(enc.qd + 3 * (COUNT - 1 - i) * of.N, qd + i * of.N, (size_t)of.N * sizeof *q);
                start[i] = 3 * (COUNT - 1 - i);
            }
            enc.b.start = start;
            memcpy(enc.theta, truth, sizeof truth), memset(&enc.state, 0, sizeof enc.state);
            CHECK_OK(turns(3, left + 1));
        }
        CHECK(turns(3, left + 1) == st);
        CHECK(same(of.ae_size, end, enc.theta) && same(1, left, left + 1));
    }
    fresh_done();
}

/* A step that must be refused, and writes nothing. */
static void no_turn(roln_status want)
{
    const roln_real *before = copy(of.ae_size, enc.theta), *top = copy(8, enc.zd_max);
    roln_real left = 7;
    CHECK(turn(&left) == want);
    CHECK(same(of.ae_size, before, enc.theta) && same(8, top, enc.zd_max) && all(1, &left, 7));
}

static void test_no_turn(uint64_t *s)
{
    static roln_real truth[MAXP];
    const roln_real bad[2] = {(roln_real)NAN, (roln_real)INFINITY};
    roln_real *psi, left = 7, was;
    int i, at, taken;
    for (taken = 0; taken < 2; taken++) { /* before the first step, and behind some */
        motion(CHART, 200, 1, 0.02, truth, s);
        psi = layer_of(enc.theta) + of.n * of.bent;
        for (i = 0; i < of.n * of.bent; i++) psi[i] += ROLN_C(0.2) * roln_normal(s);
        CHECK_OK(turns(3 * taken, &left));
        enc.b.count = 0, no_turn(ROLN_E_LENGTH);
        enc.b.count = -1, no_turn(ROLN_E_LENGTH);
        enc.b.count = 200, enc.b.qd = NULL, no_turn(ROLN_E_LENGTH);
        enc.b.qd = enc.qd;
        for (i = 0; i < 2; i++) {
            for (at = 0; at < 200 * of.N; at += 83) {
                was = enc.q[at], enc.q[at] = bad[i], no_turn(ROLN_E_NOT_FINITE), enc.q[at] = was;
                was = enc.qd[at], enc.qd[at] = bad[i], no_turn(ROLN_E_NOT_FINITE), enc.qd[at] = was;
            }
            for (at = 0; at < models[enc.k]->params; at += 7)
                was = enc.theta[at], enc.theta[at] = bad[i], no_turn(ROLN_E_NOT_FINITE), enc.theta[at] = was;
            fresh_done();
        }
        CHECK_OK(turns(3, &left)); /* none of which spoilt anything */
        check_turned(left);
    }
    motion(CHART, 200, 1, 0.02, truth, s);
    for (i = 0; i < 200 * of.N; i++) enc.q[i] = enc.q[i % of.N]; /* at rest */
    no_turn(ROLN_E_ILL_CONDITIONED);
    motion(CHART, 200, 1, 0.02, truth, s);
    enc.b.count = 2; /* too few for two dimensions */
    no_turn(ROLN_E_ILL_CONDITIONED);
    enc.b.count = 200, psi = layer_of(enc.theta) + of.n * of.bent;
    for (i = 0; i < of.bent; i++) psi[of.bent + i] = -2 * psi[i];
    no_turn(ROLN_E_ILL_CONDITIONED);
    for (i = 0; i < of.bent; i++) psi[of.bent + i] = 0;
    no_turn(ROLN_E_ILL_CONDITIONED);
    fresh_done();
}

/* NAME_chart_refine as it is called, from step to step with all of NAME_refinement; it records the range. */
static void test_shell_turn(uint64_t *s)
{
    static roln_real truth[MAXP];
    static chart_params p, was;
    static chart_refinement step;
    roln_real left = 7, left1 = 8;
    int k;
    motion(CHART, 200, 1, 0.02, truth, s);
    CHECK(chart_chart_refine(&p, &enc.b, &step, &left1) == ROLN_E_SHAPE && left1 == 8);
    p.slope = chart_model.ae.slope, p.eigenvalue_floor = chart_model.lnn.eigenvalue_floor, p.scale = scale;
    memcpy(p.theta, enc.theta, sizeof p.theta);
    for (k = 0; k < 3; k++) {
        CHECK_OK(turn(&left));
        CHECK_OK(chart_chart_refine(&p, &enc.b, &step, &left1));
        CHECK(same(chart_theta_size, p.theta, enc.theta) && same(1, &left, &left1) && same(2, p.zd_max, enc.zd_max));
        CHECK(all(2, p.z_min, -1) && all(2, p.z_max, 1));
    }
    was = p, enc.b.count = 0;
    CHECK(chart_chart_refine(&p, &enc.b, &step, &left1) == ROLN_E_LENGTH);
    CHECK(memcmp(&p, &was, sizeof p) == 0 && same(1, &left, &left1));
    enc.b.count = 200, memset(&step, 0, sizeof step); /* velocities that overflow in coordinates of -1 .. 1, but not before */
    for (k = 0; k < 200 * chart_N; k++)
        enc.qd[k] *= (roln_real)(sizeof(roln_real) == 4 ? 3e37 : 3e307);
    CHECK(chart_chart_refine(&p, &enc.b, &step, &left1) == ROLN_E_NOT_FINITE);
    CHECK(memcmp(&p, &was, sizeof p) == 0 && same(1, &left, &left1));
    enc.b.count = 0;
    memset(p.theta, 0, sizeof p.theta), fill(2, 0, p.z_min), fill(2, 0, p.z_max);
    CHECK(chart_chart_refine(&p, &enc.b, &step, &left1) == ROLN_E_LENGTH && all(2, p.z_max, 0));
}

/* ---- the verbs ---------------------------------------------------------------------------------- */

/* The residual is that of decoded against recorded q; the first half of the recording counts twice. */
static void check_left(const chart_params *p, int count, const roln_real *q, const roln_real *qd, roln_real left)
{
    static chart_work work;
    ld off = 0, all_q = 0, mean[chart_N] = {0};
    chart_state state;
    chart_latent z = {{0, 0}, {0, 0}};
    int k, i;
    for (k = 0; k < count; k++)
        for (i = 0; i < chart_N; i++) mean[i] += (ld)q[k * chart_N + i] * (k < count / 2 ? 2 : 1) / (1.5L * count);
    for (k = 0; k < count; k++) {
        memcpy(state.q, q + k * chart_N, sizeof state.q), memcpy(state.qd, qd, sizeof state.qd);
        CHECK_OK(chart_encode(p, &state, &z, &work.encode));
        CHECK_OK(chart_decode(p, &z, &state, &work.decode));
        for (i = 0; i < chart_N; i++) {
            const ld d = (ld)state.q[i] - (ld)q[k * chart_N + i], c = (ld)q[k * chart_N + i] - mean[i];
            off += d * d * (k < count / 2 ? 2 : 1), all_q += c * c * (k < count / 2 ? 2 : 1);
        }
    }
    CHECK_NEAR(left, sqrtl(off / all_q), 1e-4L);
    CHECK_BELOW(left, 0.5);
}

/* Bytes and back; bytes of another degree are refused. */
static void check_packed(const chart_params *p)
{
    static unsigned char bytes[chart_packed_size];
    static chart_params to, was;
    unsigned char *degree = bytes + 8 + 2 * 2 + 1; /* in the upper half of the third size */
    chart_pack(p, bytes);
    CHECK(*degree == 3);
    *degree = 2;
    CHECK(chart_unpack(chart_packed_size, bytes, &to) == ROLN_E_SHAPE && memcmp(&to, &was, sizeof to) == 0);
    *degree = 3;
    CHECK(chart_unpack(chart_packed_size, bytes, &to) == ROLN_OK && memcmp(&to, p, sizeof to) == 0);
}

/* A range that is none, and velocities that overflow where it becomes -1 .. 1: p stays as it was. */
static void test_shell_center(const chart_params *good)
{
    static chart_params p, was;
    p = *good, p.z_max[1] = p.z_min[1], was = p;
    CHECK(chart_chart_center(&p) == ROLN_E_RANGE && memcmp(&p, &was, sizeof p) == 0);
    p = *good, p.z_min[0] = -ROLN_C(1e-3), p.z_max[0] = -p.z_min[0];
    p.zd_max[0] = (roln_real)(sizeof(roln_real) == 4 ? 1e38 : 1e308), was = p;
    CHECK(chart_chart_center(&p) == ROLN_E_NOT_FINITE && memcmp(&p, &was, sizeof p) == 0);
}

/* The verbs of a model are those functions, in the units of the user. */
static void test_shell(uint64_t *s)
{
    enum { COUNT = 400, ALL = COUNT * chart_N };
    static chart_params p, was;
    static chart_start start;
    static chart_train work;
    static chart_chart sums_of, half, empty;
    static roln_real q[ALL], qd[ALL];
    roln_real *x, *th, left = 7, left1 = 7, qbar[chart_N];
    uint64_t seed;
    int groups = 0, i;
    take(&chart_model.ae);
    for (i = 0; i < chart_blocks; i++) /* W: a rate of its own with the bias */
        if (chart_table[i].rows == chart_monomials && chart_table[i].cols == chart_bent)
            CHECK(chart_table[i].manifold == ROLN_EUCLIDEAN && chart_table[i].group == 2), groups++;
    CHECK(groups == 1);
    CHECK(sizeof sums_of == (size_t)size_of_sums() * sizeof(double));
    th = weights_of(1, s);
    manifold(th, COUNT, 0.02, s);
    for (i = 0; i < ALL; i++) q[i] = 3 * samples[i], qd[i] = roln_normal(s);
    seed = *s;
    CHECK_OK(chart_init_pod(&p, COUNT, q, qd, qbar, s, &start.init_pod));
    roln_lnn_init(&chart_model.lnn, was.theta, &seed), roln_lnn_steepen(&chart_model.lnn, 4, was.theta);
    CHECK(seed == *s && same(chart_theta_size - chart_ae_size, was.theta, p.theta + chart_ae_size));
    CHECK_OK(chart_fit_range(&p, COUNT, q, qd, &work.fit_range));
    for (i = 0; i < 2; i++) CHECK_NEAR(p.z_min[i], -1, 100 * EPS), CHECK_NEAR(p.z_max[i], 1, 100 * EPS);
    p.eigenvalue_floor *= 2, was = p; /* numbers of another config */
    CHECK(chart_chart_center(&p) == ROLN_E_SHAPE && chart_chart_add(&p, COUNT, q, &sums_of, &start.chart_add) == ROLN_E_SHAPE);
    CHECK(chart_chart_solve(&p, &sums_of, 0, &left, &start.chart_solve) == ROLN_E_SHAPE && memcmp(&p, &was, sizeof p) == 0);
    p.eigenvalue_floor /= 2;
    p.z_max[0] = 2, p.zd_max[1] = 3; /* other coordinates: the middle of the first moves */
    was = p;
    test_shell_center(&p);
    CHECK_OK(chart_chart_center(&p));
    CHECK(all(2, p.z_min, -1) && all(2, p.z_max, 1));
    CHECK_NEAR(p.zd_max[0], was.zd_max[0] / ROLN_C(1.5), 4 * EPS * (ld)p.zd_max[0]);
    CHECK_NEAR(p.zd_max[1], 3, 200 * EPS);
    CHECK_OK(roln_chart_center(&ae, was.z_min, was.z_max, was.theta));
    CHECK(same(chart_theta_size, p.theta, was.theta));

    x = fresh(ALL);
    for (i = 0; i < ALL; i++) x[i] = q[i] * (1 / p.scale.q);
    clear(sums);
    CHECK_OK(add(p.theta, COUNT, x, sums));
    CHECK_OK(chart_chart_add(&p, COUNT, q, &sums_of, &start.chart_add));
    CHECK(memcmp(&sums_of, sums, sizeof sums_of) == 0);
    CHECK_OK(chart_chart_add(&p, COUNT / 2, q, &half, &start.chart_add));
    chart_chart_merge(&half, &sums_of);
    roln_chart_merge(size_of_sums(), half.sums, sums);
    CHECK(memcmp(&sums_of, sums, sizeof sums_of) == 0);
    was = p;
    CHECK(chart_chart_solve(&p, &empty, 0, &left, &start.chart_solve) == ROLN_E_LENGTH && memcmp(&p, &was, sizeof p) == 0);
    CHECK_OK(chart_chart_solve(&p, &sums_of, ROLN_C(1e-6), &left, &start.chart_solve));
    CHECK_OK(solve(sums, ROLN_C(1e-6), was.theta, &left1));
    CHECK(memcmp(&p, &was, sizeof p) == 0 && same(1, &left, &left1));

    check_left(&p, COUNT, q, qd, left);
    check_packed(&p);
    fresh_done();
}

/* Eight machines, each with an eighth of the recordings, add flat arrays number by number (docs/training.md): the chart and the
   update are those of one machine with all of them, but for rounding. */
static void test_fleet(uint64_t *s)
{
    enum { PARTS = 8, EACH = 50, COUNT = PARTS * EACH, ALL = COUNT * chart_N };
    enum { FIGURES = sizeof(chart_gradient) / sizeof(roln_real) };
    static const roln_loss weights = ROLN_ACC_WEIGHTS;
    static const roln_opt opt = ROLN_OPT(ROLN_C(0.02), ROLN_C(0.003));
    static chart_params whole, split;
    static chart_start start;
    static chart_train work;
    static chart_chart all_sums, part, merged;
    static chart_gradient all_of, one;
    static chart_optimiser o, o_split;
    static roln_real q[ALL], qd[ALL], qdd[ALL], sum[FIGURES];
    roln_real left = 7, left_split = 7, qbar[chart_N];
    roln_batch b = {.count = COUNT, .stride = 1, .q = q, .qd = qd, .qdd = qdd};
    int k, i, index[COUNT];
    CHECK(sizeof(chart_gradient) == 2 * ((chart_theta_size + 1) * sizeof(roln_real) + sizeof(roln_loss))); /* no padding */
    take(&chart_model.ae);
    manifold(weights_of(1, s), COUNT, 0.02, s);
    for (i = 0; i < ALL; i++) q[i] = 3 * samples[i], qd[i] = roln_normal(s), qdd[i] = roln_normal(s);
    for (i = 0; i < COUNT; i++) index[i] = i;
    b.start = index;
    CHECK_OK(chart_init_pod(&whole, COUNT, q, qd, qbar, s, &start.init_pod));
    split = whole;
    for (k = 0; k < PARTS; k++) {
        memset(&part, 0, sizeof part);
        CHECK_OK(chart_chart_add(&split, EACH, q + k * EACH * chart_N, &part, &start.chart_add));
        for (i = 0; i < (int)(sizeof part / sizeof *part.sums); i++) merged.sums[i] += part.sums[i];
    }
    CHECK_OK(chart_chart_add(&whole, COUNT, q, &all_sums, &start.chart_add));
    CHECK_OK(chart_chart_solve(&whole, &all_sums, 0, &left, &start.chart_solve));
    CHECK_OK(chart_chart_solve(&split, &merged, 0, &left_split, &start.chart_solve));
    BOUND("fleet: chart (eps)", apart(chart_theta_size, split.theta, whole.theta) / EPS, PICK(1, 150));
    CHECK_NEAR(left_split, left, PICK(1e-6, 1e-12));
    split = whole;
    CHECK_OK(chart_grad_acc(&whole, &weights, &b, &all_of, &work.grad_acc));
    for (b.count = EACH, k = 0; k < PARTS; k++, b.start += EACH) {
        memset(&one, 0, sizeof one);
        CHECK_OK(chart_grad_acc(&split, &weights, &b, &one, &work.grad_acc));
        for (i = 0; i < FIGURES; i++) sum[i] += ((const roln_real *)(const void *)&one)[i];
    }
    memcpy(&one, sum, sizeof one);
    CHECK(all(1, &one.windows, COUNT));
    BOUND("fleet: gradient (eps)", apart(chart_theta_size, one.theta, all_of.theta) / EPS, 12);
    CHECK_NEAR(roln_loss_total(&weights, &one.loss), roln_loss_total(&weights, &all_of.loss),
               20 * EPS * (ld)roln_loss_total(&weights, &all_of.loss));
    CHECK_OK(chart_update(&whole, &opt, &o, &all_of, &work.update));
    CHECK_OK(chart_update(&split, &opt, &o_split, &one, &work.update));
    BOUND("fleet: update (eps)", apart(chart_theta_size, split.theta, whole.theta) / EPS, 1);
    fresh_done();
}

void TEST_NAME(chart_model)(void)
{
    uint64_t seed = 1;
    int i;
    for (i = 0; i < 8; i++) {
        check_turns(CHART, 1, &seed), check_turns(CHART, 0, &seed), check_turns(CURVED, 0, &seed);
        check_good_start(CHART, &seed);
        check_resumed(CHART, &seed), check_resumed(CURVED, &seed);
    }
    test_no_turn(&seed);
    test_shell_turn(&seed);
    test_shell(&seed);
    test_fleet(&seed);
    print_bounds();
}
