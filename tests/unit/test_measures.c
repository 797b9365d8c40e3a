/* SPDX-License-Identifier: MIT */
/* What training looks at beside gradients: variances, the unit of inertia, errors of roll-outs, scales and range of the data, each
   against a slow count; angles on both sides of the seam; energy of a roll-out; a shuffled order. */

/* The errors in other blocks. */
#define CALLED(X) X(errors)
#define SMALL(name) one_##name
#define EVERY_BLOCK 1
#include "small_models.h"
#undef EVERY_BLOCK
#define SMALL(name) two_##name
#define EVERY_BLOCK 2
#include "small_models.h"
#undef EVERY_BLOCK
#undef CALLED
#define CALLED(X) \
    X(encode) \
    X(encode_reference) X(decode) X(step) X(reduce) X(dynamics) X(fit_range) X(variance) X(fit_inertia) X(force_variance) \
        X(errors) X(grad) X(grad_acc)
#include "small.h"

#define ONE(name) one_##name##_called
#define TWO(name) two_##name##_called
static const model *const ones[MODELS] = SMALL_TABLE(ONE, ONE), *const twos[MODELS] = SMALL_TABLE(TWO, TWO);

#include "samples.h"

void TEST_NAME(measures)(void);

/* ---- variance --------------------------------------------------------------------------------- */

enum { VAR_WINDOWS = 6 };

/* Sum over the dim numbers of a field of the variance over the windows. Angles go the shorter way, their mean from the first. */
static ld variance_of(int k, int positions, int dim, roln_real field[VAR_WINDOWS][MAXN])
{
    ld var = 0;
    int i, w;
    for (i = 0; i < dim; i++) {
        const ld first = (ld)field[0][i];
        ld mean = first;
        for (w = 0; w < VAR_WINDOWS; w++)
            mean += (positions ? difference(k, i, (ld)field[w][i], first) : (ld)field[w][i] - first) / VAR_WINDOWS;
        for (w = 0; w < VAR_WINDOWS; w++) {
            const ld off = positions ? difference(k, i, (ld)field[w][i], mean) : (ld)field[w][i] - mean;
            var += off * off / VAR_WINDOWS;
        }
    }
    return var;
}

/* Variance of the data of every term, slowly. */
static void slow_variance(int k, const instance *m, const data *d, ld *var)
{
    static roln_real x[TERMS][VAR_WINDOWS][MAXN]; /* Q .. ZDD */
    const int N = N_OF(k), n = n_OF(k);
    int w, j;
    for (w = 0; w < VAR_WINDOWS; w++) {
        const int at = first_of(&d->b, w) * N;
        memcpy(x[Q][w], d->q + at, (size_t)N * sizeof(roln_real)), memcpy(x[QD][w], d->qd + at, (size_t)N * sizeof(roln_real));
        memcpy(x[QDD][w], d->qdd + at, (size_t)N * sizeof(roln_real));
        CHECK_OK(m->of->encode_reference(m, x[Q][w], x[QD][w], x[QDD][w], x[Z][w], x[ZD][w], x[ZDD][w], ROOM(encode_reference)));
    }
    for (j = 0; j < 3; j++) {
        const ld time = powl((ld)scale.t, j), q = time / (ld)scale_of(k)->q;
        const int there = j == 0 || (j == 1 && d->b.qd) || (j == 2 && d->b.qdd);
        var[Q + j] = var[Q_PRED + j] = there ? variance_of(k, j == 0, N, x[Q + j]) * q * q : 1;
        var[Z + j] = there ? variance_of(k, j == 0, n, x[Z + j]) * time * time : 1;
    }
    var[FORCE] = 1;
}

/* A linear autoencoder, the same in other units (slope 1, biases along): the loss in parts of the variance is the same. */
static void test_variance_units(void)
{
    static const roln_scale other = {8, ROLN_C(0.125), 1};
    static data d;
    static roln_real theta[MAXP];
    static gradient g[2];
    const int N = pole_N;
    uint64_t s = 120 + POLE;
    roln_loss var = {0};
    terms part[2];
    int i, j;
    parameters(POLE, &s, theta);
    make(POLE, ODE, 6, &s, &d);
    d.b.steps = 0;
    for (i = 0; i < 2; i++) {
        const instance m = trained(models[POLE], i ? &other : &scale, theta);
        for (j = 2 * N; j < 3 * N && i; j++)
            theta[j] *= scale.q / other.q;
        part[i] = weights;
        CHECK_OK(m.of->variance(&m, &d.b, &var, room_of(models[POLE]->scratch.variance)));
        CHECK_OK(grad_of(&m, &d, &g[i]));
        roln_loss_divide(&part[i].loss, &var);
    }
    CHECK(g[0].t.loss.q > 2 * g[1].t.loss.q && g[0].t.loss.qd > 2 * g[1].t.loss.qd);
    CHECK_NEAR(roln_loss_total(&part[0].loss, &g[0].t.loss) / roln_loss_total(&part[1].loss, &g[1].t.loss), 1, 20 * EPS);
}

static void test_variance(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const instance m = trained(models[k], scale_of(k), theta);
    uint64_t s = 120 + (uint64_t)k;
    int kind, i;
    parameters(k, &s, theta);
    for (kind = 0; kind < KINDS; kind++) {
        terms got = {0}, was, part = weights;
        ld var[TERMS];
        make(k, kind, VAR_WINDOWS, &s, &d);
        slow_variance(k, &m, &d, var);
        CHECK_OK(m.of->variance(&m, &d.b, &got.loss, ROOM(variance)));
        ROOM_KEPT();
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(got.term[i], var[i], 200 * EPS * var[i]);
        roln_loss_divide(&part.loss, &got.loss);
        for (i = 0; i < TERMS; i++)
            CHECK_NEAR(part.term[i] * got.term[i], weights.term[i], 4 * EPS);
        was = got;
        d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)NAN;
        CHECK(m.of->variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)INFINITY;
        CHECK(m.of->variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        fill(MAXD, 0, d.q); /* at rest */
        CHECK(m.of->variance(&m, &d.b, &got.loss, ROOM(variance)) == ROLN_E_NOT_FINITE);
        CHECK(same(TERMS, was.term, got.term));
    }
}

/* ---- unit of inertia -------------------------------------------------------------------------- */

/* Forces tau_z [n] = J^T tau, or u [inputs], in J or its own unit, and zdd [n] behind them: their variances over the windows.
   Returns how many forces there are. */
static int slow_forces(int k, const instance *m, const data *d, ld *var)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), inputs = m->of->md->inputs, forces = inputs ? inputs : n;
    static roln_real x[2 * MAXN][8];
    int w, i;
    CHECK(d->b.count <= 8);
    for (w = 0; w < d->b.count; w++) {
        const int at = first_of(&d->b, w);
        const roln_real *tau = d->b.tau + at * F;
        roln_real z[MAXN], zd[MAXN], zdd[MAXN], tau_z[MAXN];
        CHECK_OK(
            m->of->encode_reference(m, d->b.q + at * N, d->b.qd + at * N, d->b.qdd + at * N, z, zd, zdd, ROOM(encode_reference)));
        CHECK_OK(m->of->reduce(m, z, tau, tau_z, ROOM(reduce)));
        for (i = 0; i < forces; i++)
            x[i][w] = inputs ? tau[i] * m->scale->q : tau_z[i];
        for (i = 0; i < n; i++)
            x[forces + i][w] = zdd[i];
    }
    for (i = 0; i < forces + n; i++) {
        ld mean = 0;
        for (w = 0, var[i] = 0; w < d->b.count; w++)
            mean += (ld)x[i][w] / d->b.count;
        for (w = 0; w < d->b.count; w++)
            var[i] += ((ld)x[i][w] - mean) * ((ld)x[i][w] - mean) / d->b.count;
    }
    return forces;
}

/* The unit of inertia: the geometric mean of deviation of tau_z over that of zdd; of a model with inputs, that of all together. */
static ld slow_inertia(int k, const instance *m, const data *d)
{
    ld var[3 * MAXN], logs = 0, force = 0, motion = 0;
    const int n = n_OF(k), forces = slow_forces(k, m, d, var);
    int i, count = 0;
    for (i = 0; i < forces; i++)
        force += var[i];
    for (i = 0; i < n; i++)
        motion += var[forces + i];
    if (m->of->md->inputs) return sqrtl(force / motion);
    for (i = 0; i < n; i++)
        if (var[i] > 0) logs += logl(var[i] / var[n + i]) / 2, count++;
    return expl(logs / count);
}

static void scale_forces(const data *was, roln_real by, data *to)
{
    int i;
    *to = *was, to->b.q = to->q, to->b.qd = to->qd, to->b.qdd = to->qdd, to->b.tau = to->tau;
    if (was->b.start) to->b.start = to->start;
    for (i = 0; i < MAXD; i++)
        to->tau[i] *= by;
}

/* Forces in any unit give the unit of inertia in it: to the bit if units differ by a power of two, else up to rounding. */
static void test_fit_inertia(int k)
{
    static data d, was;
    static roln_real theta[MAXP];
    const instance m = trained(models[k], scale_of(k), theta);
    const roln_real odd[4] = {(roln_real)NAN, (roln_real)INFINITY, 0, 3};
    roln_real unit_of_it = 7, first = 7, x;
    uint64_t s = 130 + (uint64_t)k;
    ld want;
    int power, i;
    parameters(k, &s, theta);
    make(k, ACC, 5, &s, &was);
    want = slow_inertia(k, &m, &was);
    CHECK_OK(m.of->fit_inertia(&m, &was.b, &first, ROOM(fit_inertia)));
    ROOM_KEPT();
    BOUND("unit of inertia, eps", fabsl((ld)first / want - 1) / EPS, 4);
    for (power = -23; power <= 23; power++) {
        scale_forces(&was, (roln_real)ldexp(1, power), &d);
        CHECK_OK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)));
        x = (roln_real)ldexp((double)first, power);
        CHECK(all(1, &unit_of_it, x));
    }
    for (power = -6; power <= 6; power++) {
        scale_forces(&was, (roln_real)powl(10, power), &d);
        CHECK_OK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)));
        BOUND("unit of inertia, powers of ten, eps", fabsl((ld)unit_of_it / (want * powl(10, power)) - 1) / EPS, 8);
    }
    x = unit_of_it;
    for (i = 0; i < 4; i++) { /* no torque, none that is a number, none that changes on a model whose joints are its coordinates */
        fill(MAXD, odd[i], d.tau);
        if (i == 3 && models[k]->md->ae.layers > 0) continue;
        CHECK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE && all(1, &unit_of_it, x));
    }
    scale_forces(&was, 1, &d);
    d.q[first_of(&d.b, 0) * N_OF(k)] = (roln_real)NAN;
    CHECK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE);
    for (i = 0; i < 4; i++) {
        roln_batch b = was.b;
        if (i == 0) b.tau = NULL;
        if (i == 1) b.qd = NULL;
        if (i == 2) b.qdd = NULL;
        if (i == 3) b.count = 0;
        CHECK(m.of->fit_inertia(&m, &b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_LENGTH);
    }
    CHECK(all(1, &unit_of_it, x));
    was.b.count = 2; /* windows, their first samples: what comes behind does not count */
    CHECK_OK(m.of->fit_inertia(&m, &was.b, &x, ROOM(fit_inertia)));
    for (i = 0; i < MAXD; i++)
        if (i / F_OF(k) != first_of(&was.b, 0) && i / F_OF(k) != first_of(&was.b, 1)) was.tau[i] = (roln_real)NAN;
    CHECK(m.of->fit_inertia(&m, &was.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_OK && all(1, &unit_of_it, x));
}

/* A joint whose velocity never changes does not count either. A machine whose inertia is beyond 1e+-18 has no unit of it, and one
   whose forces are no numbers of this precision in units of the networks has no variances of them. */
static void test_far(int k)
{
    static data d, was;
    static roln_real theta[MAXP];
    const instance m = trained(models[k], scale_of(k), theta);
    const int N = N_OF(k);
    const roln_real far = (roln_real)ldexp(1, 60), near = (roln_real)ldexp(1, -10);
    roln_real unit_of_it = 7, got[MAXN];
    uint64_t s = 150 + (uint64_t)k;
    ld var[3 * MAXN], logs = 0;
    int i, j;
    parameters(k, &s, theta);
    make(k, ACC, 5, &s, &was);
    for (i = 0; i < 2; i++) {
        scale_forces(&was, i ? 1 / far : far, &d);
        for (j = 0; j < MAXD; j++) d.qdd[j] *= i ? 1 / near : near;
        CHECK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE && all(1, &unit_of_it, 7));
    }
    scale_forces(&was, 1, &d);
    for (j = 0; j < MAXD / N; j++) d.qdd[j * N] = 3;
    (void)slow_forces(k, &m, &d, var);
    for (i = 1; i < N; i++) logs += logl(var[i] / var[N + i]) / 2;
    CHECK_OK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)));
    BOUND("unit of inertia, a joint at rest, eps", fabsl((ld)unit_of_it / expl(logs / (N - 1)) - 1) / EPS, 4);
    for (j = 0; j < MAXD; j++) d.qdd[j] = 3;
    unit_of_it = 7;
    CHECK(m.of->fit_inertia(&m, &d.b, &unit_of_it, ROOM(fit_inertia)) == ROLN_E_NOT_FINITE && all(1, &unit_of_it, 7));
    for (i = 0; i < 2; i++) {
        roln_scale sc = scale;
        instance other = m;
        sc.m = PICK(i ? ROLN_C(1e30) : ROLN_C(1e-30), i ? ROLN_C(1e200) : ROLN_C(1e-200)), other.scale = &sc;
        fill(MAXN, 7, got);
        CHECK(m.of->force_variance(&other, &was.b, got, ROOM(force_variance)) == ROLN_E_NOT_FINITE && all(MAXN, got, 7));
    }
}

/* Variances of forces, in units of the networks, against a slow count; of joints without a motor, or at rest; statuses. */
static void test_force_variance(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const instance m = trained(models[k], scale_of(k), theta);
    const int n = n_OF(k), F = F_OF(k), plain = models[k]->md->ae.layers == 0;
    const ld t = (ld)m.scale->t, by = t * t / (ld)m.scale->m;
    roln_real got[MAXN], was[MAXN];
    ld var[3 * MAXN];
    uint64_t s = 140 + (uint64_t)k;
    int i, j;
    parameters(k, &s, theta);
    make(k, ACC, 5, &s, &d);
    fill(MAXN, 7, got);
    if (m.of->md->inputs > 0) {
        CHECK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)) == ROLN_E_SHAPE && all(MAXN, got, 7));
        return;
    }
    (void)slow_forces(k, &m, &d, var);
    CHECK_OK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)));
    ROOM_KEPT();
    for (i = 0; i < n; i++)
        BOUND("variance of forces, eps", fabsl((ld)got[i] / (var[i] * by * by) - 1) / EPS, 10);
    CHECK(all(MAXN - n, got + n, 7));
    memcpy(was, got, sizeof was);
    if (plain && n > 1) {
        for (j = 0; j < MAXD / F; j++)
            d.tau[j * F] = 3; /* a motor that never changes: as if M = I */
        CHECK_OK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)));
        BOUND("variance of forces, no motor, eps", fabsl((ld)got[0] / (var[n] * t * t * t * t) - 1) / EPS, 10);
        CHECK(same(n - 1, got + 1, was + 1));
        for (j = 0; j < MAXD / N_OF(k); j++)
            d.qdd[j * N_OF(k)] = 0;
        CHECK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)) == ROLN_OK && all(1, got, 1));
    }
    memcpy(was, got, sizeof was);
    fill(MAXD, 0, d.tau);
    CHECK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)) == ROLN_E_NOT_FINITE);
    d.tau[first_of(&d.b, 1) * F] = (roln_real)NAN;
    CHECK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)) == ROLN_E_NOT_FINITE);
    d.b.tau = NULL;
    CHECK(m.of->force_variance(&m, &d.b, got, ROOM(force_variance)) == ROLN_E_LENGTH && same(MAXN, got, was));
}

/* ---- roll-outs -------------------------------------------------------------------------------- */

/* Energy gained = work of the force (Simpson), over 200 steps of rk4. */
static void test_rollout(void)
{
    enum { STEPS = 200 };
    static roln_real theta[MAXP];
    const instance m = trained(models[PLAIN], &scale, theta);
    const roln_real h = PICK(ROLN_C(0.015625), 0.00390625);
    roln_real z[2], zd[2], tau[6], tau_z[2], T = 0, V = 0;
    const terms_at energies = {NULL, NULL, NULL, NULL, &T, &V};
    uint64_t s = 60;
    ld start = 0, work = 0, moved = 0;
    int k;
    parameters(PLAIN, &s, theta);
    dyadic(6, 1, &s, tau), dyadic(2, 1, &s, z), dyadic(2, 1, &s, zd);
    for (k = 0; k <= STEPS; k++) {
        ld power;
        CHECK_OK(m.of->dynamics(&m, z, zd, &energies, room_of(m.of->scratch.dynamics)));
        CHECK_OK(m.of->reduce(&m, z, tau, tau_z, room_of(m.of->scratch.reduce)));
        power = (ld)tau_z[0] * (ld)zd[0] + (ld)tau_z[1] * (ld)zd[1];
        if (k == 0) start = (ld)T + (ld)V;
        work += (ld)h * power * (k == 0 || k == STEPS ? 1 : k % 2 ? 4 : 2) / 3;
        moved += fabsl(power) * (ld)h;
        if (k < STEPS) CHECK_OK(m.of->step(&m, z, zd, tau, h, room_of(m.of->scratch.step)));
    }
    BOUND("energy of a roll-out", fabsl((ld)T + (ld)V - start - work) / moved, PICK(4e-6, 1e-8));
    CHECK(fabsl((ld)T + (ld)V - start) > 0.05L * moved);
}

enum { MAXE = 10 };

/* Adds the errors of joint i in window w, sample by sample, to ref [MAXE][4]. */
static void slow_errors(int k, const instance *m, const data *d, int w, int every, const roln_real *qbar, int i,
                        ld ref[MAXE][4])
{
    const int N = N_OF(k), first = first_of(&d->b, w);
    roln_real z[MAXN], zd[MAXN], q[MAXN], qd[MAXN];
    int h, j;
    CHECK_OK(m->of->encode(m, d->q + first * N, d->qd + first * N, z, zd, ROOM(encode)));
    for (h = 0; h <= d->b.steps; h++) {
        const roln_real *q_data = d->q + (first + h) * N, *qd_data = d->qd + (first + h) * N;
        if (h > 0) CHECK_OK(m->of->step(m, z, zd, d->tau + (first + h - 1) * F_OF(k), d->h, ROOM(step)));
        if (h % every != 0) continue;
        CHECK_OK(m->of->decode(m, z, zd, q, qd, ROOM(decode)));
        {
            const ld e[4] = {difference(k, i, (ld)q[i], (ld)q_data[i]), difference(k, i, (ld)q_data[i], (ld)qbar[i]),
                             (ld)qd[i] - (ld)qd_data[i], (ld)qd_data[i]};
            for (j = 0; j < 4; j++)
                ref[h / every][j] += e[j] * e[j];
        }
    }
}

/* The sums got are those of ref, to rounding. */
static void check_errors(int k, const roln_error *got, int stride, ld ref[MAXE][4])
{
    int i, j;
    for (i = 0; i < MAXE; i++, got += stride) {
        const double sums[4] = {got->q, got->q_var, got->qd, got->qd_var};
        for (j = 0; j < 4; j++)
            CHECK_NEAR(sums[j], ref[i][j], 60 * EPS * (ref[i][j] + (k == BARE ? 1 : 0)));
    }
}

/* The errors of windows of a model, in the blocks of `of`. */
static void check_windows(int k, const instance *m, const model *of, const data *d, const roln_real *qbar)
{
    const instance other = trained(of, m->scale, m->theta);
    const int errors = of->scratch.errors;
    int every, w, i, j;
    for (every = 1; every <= 2; every++) {
        ld all_joints[MAXE][4] = {{0}};
        roln_error e[MAXE], joints[MAXE * MAXN], windows[MAXE * WINDOWS], alone[MAXE];
        memset(e, 0, sizeof e), memset(joints, 0, sizeof joints), memset(alone, 0, sizeof alone);
        CHECK_OK(of->errors(&other, &d->b, d->h, every, qbar, &(roln_errors){e, joints, windows}, room_of(errors)));
        ROOM_KEPT();
        CHECK_OK(of->errors(&other, &d->b, d->h, every, qbar, &(roln_errors){alone, NULL, NULL}, room_of(errors)));
        CHECK(memcmp(e, alone, sizeof e) == 0);
        for (w = 0; w < d->b.count; w++) { /* each window as if it were alone */
            roln_batch one = d->b;
            const int start = first_of(&d->b, w);
            one.count = 1, one.start = &start;
            CHECK_OK(of->errors(&other, &one, d->h, every, qbar, &(roln_errors){alone, NULL, NULL}, room_of(errors)));
            for (i = 0; i <= d->b.steps / every; i++)
                CHECK(memcmp(&alone[i], &windows[i * d->b.count + w], sizeof *alone) == 0);
        }
        for (j = 0; j < N_OF(k); j++) {
            ld ref[MAXE][4] = {{0}};
            for (w = 0; w < d->b.count; w++)
                slow_errors(k, m, d, w, every, qbar, j, ref);
            for (i = 0; i < 4 * MAXE; i++)
                all_joints[i / 4][i % 4] += ref[i / 4][i % 4];
            check_errors(k, joints + j, N_OF(k), ref);
        }
        check_errors(k, e, 1, all_joints);
    }
}

/* In blocks of one, two, or all five windows. */
static void test_errors(int k)
{
    static data d;
    static roln_real theta[MAXP];
    const model *const blocks[3] = {models[k], ones[k], twos[k]};
    const instance own = trained(models[k], scale_of(k), theta);
    roln_real qbar[MAXN];
    roln_error e[MAXE];
    uint64_t s = 70;
    int i;
    parameters(k, &s, theta);
    make(k, ODE, 5, &s, &d);
    for (i = 0; i < MAXD; i++)
        d.qd[i] /= 8, d.tau[i] /= 8;
    dyadic(N_OF(k), 1, &s, qbar);
    for (i = 0; i < 3; i++)
        check_windows(k, &own, blocks[i], &d, qbar);
    /* a step that fails ends the call: the errors before it are there, those behind it are not */
    memset(e, 0, sizeof e);
    d.tau[(d.b.steps - 1) * F_OF(k)] = (roln_real)INFINITY; /* last step of the first window */
    CHECK(own.of->errors(&own, &d.b, d.h, 1, qbar, &(roln_errors){e, NULL, NULL}, ROOM(errors)) == ROLN_E_NOT_FINITE);
    CHECK(e[0].q_var > 0 && e[d.b.steps - 1].q_var > 0 && e[d.b.steps].q_var <= 0);
}

/* ---- data -------------------------------------------------------------------- */

/* The range of an angle is an arc on any turn: within it, outside, at its ends, with a margin. That of another joint is not. */
static void check_arc(const wheel_params *p)
{
    const ld turn = 8 * atanl(1);
    wheel_latent s = {{0}, {0}};
    int at, k, j, i;
    for (j = 0; j < 3; j += 2)
        for (at = -5; at <= 5; at++)
            for (k = -2; k <= 6; k++) { /* from half of the arc in front of it to half behind it */
                const ld low = (ld)p->z_min[j], high = (ld)p->z_max[j];
                for (i = 0; i < 3; i++)
                    s.z[i] = (p->z_min[i] + p->z_max[i]) / 2;
                s.z[j] = (roln_real)(low + (high - low) * (0.01L + k * 0.245L) + at * turn);
                CHECK(wheel_in_range(p, &s) == (k >= 0 && k <= 4));
                CHECK(wheel_i_in_range(p, ROLN_C(0.3), s.z, s.zd) == (k >= -1 && k <= 5));
                s.z[1] = p->z_max[1] + (roln_real)turn;
                CHECK(!wheel_in_range(p, &s));
            }
    for (j = 0; j < 3; j++)
        s.z[j] = p->z_max[j];
    CHECK(wheel_in_range(p, &s));
    s.z[2] = (roln_real)NAN;
    CHECK(!wheel_in_range(p, &s));
    s.z[2] = 2 * ROLNI_ANGLE_END;
    CHECK(!wheel_in_range(p, &s));
}

/* On both sides of pi angles are as near to each other as anywhere: scales, range, variance and roll-out errors of a slow motion
   that was recorded with jumps by a turn are those of the same motion recorded without. */
static void test_seam(void)
{
    enum { SAMPLES = 12, N = wheel_N };
    static wheel_params p, of;
    static wheel_start start;
    static wheel_train train;
    const ld turn = 8 * atanl(1);
    const roln_real round_it[SAMPLES] = {0, 1, 2, 3, -1, -2, -ROLN_C(2.625), -ROLN_C(2.875), -3, 0, 1, 2};
    roln_real q[2][SAMPLES * N], qd[SAMPLES * N], bar[2][N];
    roln_loss var[2] = {{0}};
    roln_error e[2][2];
    roln_batch b = {.count = SAMPLES - 1, .steps = 1, .stride = 1, .qd = qd};
    int first[SAMPLES], k, i, jumps = 0;
    uint64_t s = 5;
    for (k = 0; k < SAMPLES; k++)
        for (first[k] = k, i = 0; i < N; i++) {
            const ld at = turn / 2 + 0.0625L * (k - 5) * (i + 1);
            q[0][k * N + i] = (roln_real)at, q[1][k * N + i] = (roln_real)(i == 1 ? at : remainderl(at, turn));
            qd[k * N + i] = ROLN_C(0.0625) * (roln_real)(i + 1) / dt * (1 + ROLN_C(0.0009765625) * (roln_real)(k % 2)); /* varies */
            jumps += q[1][k * N + i] < 0;
        }
    CHECK(jumps > 8);
    b.start = first;
    for (k = 0; k < 2; k++) {
        b.q = q[k], b.count = SAMPLES - 1, b.steps = 1;
        CHECK_OK(wheel_init_pod(&p, SAMPLES, q[k], qd, bar[k], &s, &start.init_pod));
        CHECK(all(1, &p.scale.q, 1) && p.scale.t > 0);
        if (k == 0) of = p; /* networks of one seed */
        CHECK(all(1, &p.scale.t, of.scale.t));
        CHECK_OK(wheel_fit_range(&p, SAMPLES, q[k], qd, &train.fit_range));
        for (i = 0; i < N; i++) {
            if (i != 1) CHECK_NEAR(roln_wrap(bar[k][i] - bar[0][i]), 0, 40 * EPS);
            if (i != 1) CHECK_NEAR(p.z_max[i], -turn / 2 + 0.0625L * 6 * (i + 1), 8 * EPS); /* two units in the last place of 4 */
            if (i != 1) CHECK_NEAR(p.z_min[i], -turn / 2 - 0.0625L * 5 * (i + 1), 8 * EPS);
        }
        check_arc(&p);
        CHECK_NEAR(p.z_max[1], (ld)q[0][(SAMPLES - 1) * N + 1], EPS);
        CHECK_OK(wheel_variance(&of, &b, &var[k], &train.variance));
        CHECK_OK(wheel_errors(&of, &b, dt, 1, bar[k], &(roln_errors){e[k], NULL, NULL}, &train.errors));
        CHECK_BELOW(var[k].q, 3);
        CHECK_NEAR(var[k].q, var[0].q, 200 * EPS * (ld)var[0].q);
        for (i = 0; i < 2; i++) {
            CHECK_NEAR(e[k][i].q_var, e[0][i].q_var, 400 * EPS * (ld)e[0][i].q_var);
            CHECK_NEAR(e[k][i].q, e[0][i].q, 400 * EPS * ((ld)e[0][i].q + 1));
        }
        CHECK_BELOW(e[k][1].q, 3);
    }
    for (k = 0; k < SAMPLES; k++) /* 3 rad to both sides: less than a twentieth of the circle is left */
        for (i = 0; i < N; i++)
            q[0][k * N + i] = i ? ROLN_C(0.45) * (roln_real)k : round_it[k];
    CHECK_OK(wheel_fit_range(&p, SAMPLES, q[0], qd, &train.fit_range));
    CHECK_NEAR(p.z_min[0], -turn / 2, 4 * EPS), CHECK_NEAR(p.z_max[0], turn / 2, 4 * EPS);
    CHECK_NEAR(p.z_min[2], 0, 20 * EPS), CHECK_NEAR(p.z_max[2], 0.45L * 11, 20 * EPS);
    CHECK(!wheel_params_mismatch(&of));
    of.scale.q = ROLN_C(0.5); /* no turn of q is one of z */
    CHECK(wheel_params_mismatch(&of));
    CHECK(wheel_errors(&of, &b, dt, 1, bar[0], &(roln_errors){e[0], NULL, NULL}, &train.errors) == ROLN_E_SHAPE);
}

/* No sample is outside of the range that it was fitted to, on whatever turn. */
static void test_own_range(void)
{
    static wheel_params p;
    static wheel_start start;
    static wheel_train train;
    uint64_t s = 6;
    int round, k, i, out = 0;
    CHECK_OK(wheel_init(&p, &s, &start.init));
    for (round = 0; round < 20000; round++) {
        roln_real q[3][wheel_N], qd[3][wheel_N];
        wheel_latent z;
        const roln_real middle = 7 * (roln_uniform(&s) - ROLN_C(0.5));
        for (k = 0; k < 3; k++)
            for (i = 0; i < wheel_N; i++) {
                q[k][i] = middle + 2 * roln_uniform(&s) - 1, qd[k][i] = 1;
                if (round % 2 && i != 1) q[k][i] = roln_wrap(q[k][i]);
            }
        CHECK_OK(wheel_fit_range(&p, 3, q[0], qd[0], &train.fit_range));
        for (k = 0; k < 3; k++) {
            memcpy(z.z, q[k], sizeof z.z), memcpy(z.zd, qd[k], sizeof z.zd);
            out += !wheel_in_range(&p, &z);
        }
    }
    CHECK_BELOW(out, 0);
}

static void test_shuffle(void)
{
    int index[100], again[100], seen[100] = {0}, orders[6] = {0}, one = 5, i;
    uint64_t s = 1, r = 1;
    for (i = 0; i < 100; i++)
        index[i] = again[i] = i;
    roln_shuffle(100, index, &s), roln_shuffle(100, again, &r);
    CHECK(memcmp(index, again, sizeof index) == 0 && s == r);
    for (i = 0; i < 100; i++)
        seen[index[i]]++;
    for (i = 0; i < 100; i++)
        CHECK(seen[i] == 1);
    for (i = 0; i < 6000; i++) { /* every order of three equally often */
        int t[3] = {0, 1, 2};
        roln_shuffle(3, t, &s);
        orders[2 * t[0] + (t[1] > t[2])]++;
    }
    for (i = 0; i < 6; i++)
        CHECK_NEAR(orders[i], 1000, 150);
    roln_shuffle(0, &one, &s), roln_shuffle(1, &one, &s);
    CHECK(one == 5);
}

/* Scales and range of ten samples. */
static void test_fit(void)
{
    enum { SAMPLES = 10, N = plain_N };
    static roln_real theta[MAXP];
    const instance m = trained(models[PLAIN], &unit, theta);
    roln_real q[SAMPLES * N], qd[SAMPLES * N], still[SAMPLES * N] = {0}, bar[N], lo[2], hi[2], top[2];
    roln_real *work = room_of(models[PLAIN]->scratch.fit_range);
    roln_scale sc = {7, 7, 7};
    ld mean[N] = {0}, q2 = 0, qd2 = 0;
    int at_lo = 0, at_hi = 0, at_top = 0, i, j;
    uint64_t s = 1;
    dyadic(SAMPLES * N, 3, &s, q), dyadic(SAMPLES * N, 5, &s, qd);
    CHECK_OK(roln_fit_scale(&plain_model, SAMPLES, q, qd, bar, &sc, NULL));
    for (i = 0; i < SAMPLES * N; i++)
        mean[i % N] += (ld)q[i] / SAMPLES;
    for (i = 0; i < SAMPLES * N; i++) {
        q2 += ((ld)q[i] - mean[i % N]) * ((ld)q[i] - mean[i % N]) / SAMPLES;
        qd2 += (ld)qd[i] * (ld)qd[i] / SAMPLES;
    }
    for (i = 0; i < N; i++)
        CHECK_NEAR(bar[i], mean[i], 20 * EPS);
    CHECK_NEAR(sc.q, sqrtl(q2 / 2), 20 * EPS * (ld)sc.q);
    CHECK_NEAR(sc.t, sqrtl(q2 / qd2), 20 * EPS);
    sc.q = sc.t = 7;
    CHECK(roln_fit_scale(&plain_model, SAMPLES, q, still, bar, &sc, NULL) == ROLN_E_NOT_FINITE);
    CHECK(all(1, &sc.q, 7) && all(1, &sc.t, 7));
    CHECK(roln_fit_scale(&plain_model, 0, q, qd, bar, &sc, NULL) == ROLN_E_LENGTH && all(1, &sc.q, 7) && all(1, &sc.t, 7));

    parameters(PLAIN, &s, theta);
    CHECK_OK(m.of->fit_range(&m, SAMPLES, q, qd, lo, hi, top, work));
    for (i = 0; i < SAMPLES; i++) {
        roln_real z[2], zd[2];
        CHECK_OK(m.of->encode(&m, q + N * i, qd + N * i, z, zd, work));
        for (j = 0; j < 2; j++) {
            CHECK(z[j] >= lo[j] && z[j] <= hi[j] && ROLN_ABS(zd[j]) <= top[j]);
            at_lo += z[j] <= lo[j], at_hi += z[j] >= hi[j], at_top += ROLN_ABS(zd[j]) >= top[j];
        }
    }
    CHECK(at_lo == 2 && at_hi == 2 && at_top == 2);
    CHECK(m.of->fit_range(&m, 0, q, qd, lo, hi, top, work) == ROLN_E_LENGTH);
}

void TEST_NAME(measures)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_variance(k);
        test_fit_inertia(k);
        test_force_variance(k);
        if (k == BARE) test_far(k); /* its joints are its coordinates */
        test_errors(k);
    }
    test_variance_units();
    test_rollout();
    test_shuffle();
    test_fit();
    test_seam();
    test_own_range();
    print_bounds();
}
