/* SPDX-License-Identifier: MIT */
/* Edges of a Lagrangian network (roln_lnn.h): statuses of all that may fail, with outputs untouched; layers that change nothing;
   where an exponential leaves the range; iterations of the midpoint rule; sizes of tapes and scratch. */
#include "roln_lnn.h"
#include "network.h"

void TEST_NAME(lnn_edges)(void);

/* ---- statuses ---- */

/* Every call that can fail, on the same inputs, nb = 2: all must report st and leave what they write alone. */
static void check_fails(const roln_lnn *f, const roln_real *th, const roln_real *s, const roln_real *tau, roln_status st,
                        int terms_too)
{
    const int n = f->n, nx = n * n + 3 * n + 2;
    roln_real *tape = fresh(TAPE(2, 0, 2)), *w = fresh(any_work(2)), *out = zeros(4 * n), *zero = zeros(4 * n + nx), *X = zeros(nx);
    roln_real s1[2 * MAXN];
    roln_force fc;
    roln_system sys;
    int scheme;
    fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = copy(2 * n, tau), fc.jac_zd = NULL;
    sys.theta = th, sys.force = &fc;
    memcpy(s1, s, sizeof *s * (size_t)n), memcpy(s1 + n, s + 2 * n, sizeof *s * (size_t)n);
    CHECK(roln_lnn_zdd(f, 0, 2, th, s, tau, out, tape, w) == st);
    CHECK(roln_lnn_inverse(f, 0, 2, th, s, NULL, tau, out, tape, w) == st);
    CHECK(roln_lnn_inverse(f, 0, 2, th, s, tau, tau, out, tape, w) == st);
    CHECK(roln_lnn_start(f, &sys, 0, 2, ROLN_C(0.1), s, s + 2 * n, out, tape, w) == st);
    for (scheme = ROLN_EULER; scheme <= ROLN_LEAPFROG; scheme++)
        CHECK(roln_lnn_step(f, &sys, scheme, 0, 2, ROLN_C(0.01), s, out, tape, w) == st);
    if (terms_too) CHECK(terms(th, s1, -1, X, tape, w) == st);
    CHECK(same(4 * n, out, zero) && same(nx, X, zero));
}

/* What NaN in parameter i makes. */
static roln_status expected(const roln_lnn *f, int i)
{
    int mirror, part = part_of(i, &mirror);
    if (part == NETWORKS) {
        const int in_mass = i < roln_mlp_params(&f->mass_net);
        return f->mass == ROLN_CHOLESKY && in_mass ? ROLN_E_NOT_SPD : ROLN_E_NOT_FINITE;
    }
    if (part == BASE) return ROLN_E_NOT_SPD;
    if (part == GYRO_W) return ROLN_E_NOT_FINITE;
    /* of B: met by the next roln_eig, or by the Cholesky factor of M */
    return i < layer_at[f->layers - 1] ? ROLN_E_NOT_FINITE : ROLN_E_NOT_SPD;
}

enum { STATUS_SHAPES = 7 };
static roln_lnn status_shape(int i)
{
    switch (i) {
    case 0: return shape(2, 0, 2, 3, 0);
    case 1: return shape(2, 1, 2, 3, 0);
    case 2: return cholesky(shape(2, 0, 2, 3, 0));
    case 3: return damped(shape(2, 1, 2, 3, 0));
    case 4: return damped(behind(shape(2, 1, 2, 2, 0), 1));
    case 5: return behind(shape(2, 0, 2, 2, 0), 2); /* the first layer can spoil the log of the second */
    default: return damped(cholesky(shape(2, 0, 2, 2, 0)));
    }
}

#define DRAW roln_real *th = weights(f, seed), *s = normal(8, 0.7, seed), *tau = normal(4, 1, seed)

/* `bad`, which is not finite, in every number of the states, of the forces and of the parameters. */
static void check_not_finite(const roln_lnn *f, roln_real bad, uint64_t *seed)
{
    const int np = roln_lnn_params(f), nm = roln_mlp_params(&f->mass_net), hid = 3 * f->mass_net.size[1];
    int i, j;
    for (i = 0; i < 8; i++) {
        DRAW;
        s[i] = bad;
        check_fails(f, th, s, tau, ROLN_E_NOT_FINITE, i % 4 < 2);
        fresh_done();
    }
    for (i = 0; i < 4; i++) {
        DRAW;
        tau[i] = bad;
        check_fails(f, th, s, tau, ROLN_E_NOT_FINITE, 0);
        fresh_done();
    }
    for (i = 0; i < np; i++) {
        DRAW;
        const int in_net = i < nm ? i : i < damper_at ? i - nm : i - damper_at, part = part_of(i, &j);
        if (i == damper_at - 1) continue; /* the bias of V moves nothing */
        if (bad == bad && part == NETWORKS && in_net < hid) continue; /* infinity: softplus' of -Inf is 0, may stay finite */
        if (part == BASE && j > i) continue; /* the upper triangle of P is not read */
        th[i] = bad;
        check_fails(f, th, s, tau, expected(f, i), 1);
        fresh_done();
    }
}

/* Masses without a range, P not SPD. */
static void check_mass_fails(const roln_lnn *f, uint64_t *seed)
{
    const int nm = roln_mlp_params(&f->mass_net), w = f->n;
    int i;
    if (f->mass != ROLN_CHOLESKY) {
        DRAW;
        for (i = 0; i < w; i++) th[nm - ROLN_TRI(w) + i] = 120; /* biases of the diagonal of U */
        check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
        th[nm - ROLN_TRI(w)] = -120, th[nm - ROLN_TRI(w) + 1] = 0;
        check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
        fresh_done();
    }
    for (i = 0; f->base && i < w; i++) {
        DRAW;
        th[base_at + i * (w + 1)] = i % 2 ? 0 : -1;
        check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
        fresh_done();
    }
}

/* Layer i: W too large for exp, and B not SPD, of which the next log, or the factor of M, tells. */
static void check_layer_fails(const roln_lnn *f, int i, uint64_t *seed)
{
    const int n = f->n;
    roln_real *W, keep[ROLN_TRI(MAXN)];
    int j;
    DRAW;
    W = th + layer_at[i];
    memcpy(keep, W, sizeof *keep * (size_t)ROLN_TRI(n));
    for (j = 0; j < ROLN_TRI(n); j++) W[j] *= 3000;
    check_fails(f, th, s, tau, ROLN_E_RANGE, 1);
    memcpy(W, keep, sizeof *keep * (size_t)ROLN_TRI(n));
    for (j = 0; j < n * n; j++) W[ROLN_TRI(n) + j] = j % (n + 1) ? 0 : -1;
    check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
    fresh_done();
}

/* L = 0: M = least I, least 0. */
static void check_cholesky_fails(roln_lnn f0, uint64_t *seed)
{
    roln_lnn *f = &f0;
    const int nm = roln_mlp_params(&f->mass_net);
    int i;
    DRAW;
    for (i = 0; i < nm; i++) th[i] = 0;
    f->eigenvalue_floor = 0, m.f.eigenvalue_floor = 0;
    check_fails(f, th, s, tau, ROLN_E_NOT_SPD, 1);
    fresh_done();
}
#undef DRAW

/* Steps that leave the range, or whose h is none. */
static void check_step_fails(const roln_lnn *f, uint64_t *seed)
{
    roln_real *th = weights(f, seed), *s = normal(8, 0.7, seed), out[8], zero[8];
    roln_real *tape = fresh(TAPE(1, 0, 2)), *w = fresh(any_work(2));
    const roln_system sys = {th, NULL};
    int i;
    memset(zero, 0, sizeof zero), memset(out, 0, sizeof out);
    for (i = 4; i < 8; i++) s[i] *= 300; /* far outside */
    CHECK(roln_lnn_step(f, &sys, ROLN_MIDPOINT, 0, 2, 1, s, out, tape, w) != ROLN_OK);
    CHECK(same(8, out, zero));
    for (i = 4; i < 8; i++) s[i] /= 300;
    CHECK(roln_lnn_step(f, &sys, ROLN_EULER, 0, 2, (roln_real)NAN, s, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(roln_lnn_step(f, &sys, ROLN_RK4, 0, 2, (roln_real)INFINITY, s, out, tape, w) != ROLN_OK);
    CHECK(roln_lnn_start(f, &sys, 0, 2, 0, s, s + 4, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(roln_lnn_start(f, &sys, 0, 2, (roln_real)NAN, s, s + 4, out, tape, w) == ROLN_E_NOT_FINITE);
    CHECK(same(8, out, zero));
    fresh_done();
}

static void test_status(uint64_t *seed)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    int which, b, i;
    for (which = 0; which < STATUS_SHAPES; which++) {
        roln_lnn f = status_shape(which);
        for (b = 0; b < 3; b++) check_not_finite(&f, bad[b], seed);
        check_mass_fails(&f, seed);
        for (i = 0; i < f.layers; i++) check_layer_fails(&f, i, seed);
        if (f.mass == ROLN_CHOLESKY) check_cholesky_fails(f, seed);
        check_step_fails(&f, seed);
    }
}

/* ---- edges ---- */

/* Layers as roln_lnn_init makes them: the matrix passes as it is. */
static void test_identity(uint64_t *seed)
{
    int q, i;
    for (q = 1; q < 4; q++) {
        roln_lnn f = shape(3, 1, 2, 4, 0), f1 = behind(f, q);
        roln_dynamics_out out = {NULL, NULL, NULL, NULL, NULL, NULL};
        roln_real *th, *th1, *s, M[2][9], *tape, *w;
        ld ref[9];
        th = weights(&f1, seed), s = normal(6, 0.8, seed), th1 = copy(roln_lnn_params(&f1), th);
        roln_lnn_init(&f1, th1, seed);
        for (i = 0; i < layer_at[0]; i++) th1[i] = th[i];
        tape = fresh(TAPE(1, 0, 1)), w = fresh(TERMS_WORK);
        out.M = M[1];
        CHECK(roln_lnn_dynamics(&f1, th1, s, &out, tape, w) == ROLN_OK);
        set_sizes(&f);
        tape = fresh(TAPE(1, 0, 1)), w = fresh(TERMS_WORK);
        out.M = M[0];
        CHECK(roln_lnn_dynamics(&f, th1, s, &out, tape, w) == ROLN_OK);
        widen(9, M[0], ref);
        BOUND("layers that change nothing: M (eps)", distance(9, M[1], ref) / EPS, 40);
        fresh_done();
    }
}

/* One joint with log M = 39.9925 + z/100 and no potential, h v = 1: exp holds M up to z = 3/4. So one evaluation of a step alone
   fails: the last one, of M at the end; with a force that of a later iteration at the middle; or the first. */
static void test_edge(uint64_t *seed)
{
    const roln_lnn f = shape(1, 0, 2, 1, 0);
    roln_real *th = weights(&f, seed), s[2] = {0, 1}, sn[2] = {0, 0}, z[2] = {0, 1}, push;
    roln_real *tape = fresh(TAPE(1, 0, 1)), *w = fresh(any_work(1));
    roln_dynamics_out none = {NULL, NULL, NULL, NULL, NULL, NULL};
    roln_force fc;
    roln_system sys;
    int i;
    for (i = 0; i < roln_lnn_params(&f); i++) th[i] = 0;
    th[0] = 1, th[1] = 20; /* softplus(z + 20) = z + 20 to rounding */
    th[2] = ROLN_C(0.01), th[3] = ROLN_C(39.7925);
    fc.eval = const_eval, fc.bwd = NULL, fc.jac = NULL, fc.ctx = &push, fc.jac_zd = NULL;
    sys.theta = th, sys.force = NULL;
    for (i = 0; i < 3; i++) {
        const roln_real at[2] = {(roln_real)i / 2, 0};
        CHECK(roln_lnn_dynamics(&f, th, at, &none, tape, w) == (i == 2 ? ROLN_E_RANGE : ROLN_OK));
    }
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_start(&f, &sys, 0, 1, 1, z, z + 1, sn, tape, w) == ROLN_E_RANGE);
    s[1] = 0, push = 4 * roln_exp(40), sys.force = &fc; /* v = 0 at first, then 2 */
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_step(&f, &sys, ROLN_RK4, 0, 1, 2, s, sn, tape, w) == ROLN_E_RANGE);
    s[0] = 1, s[1] = -1, z[0] = 2, z[1] = ROLN_C(0.5), sys.force = NULL; /* the first evaluation alone fails */
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_E_RANGE);
    CHECK(roln_lnn_start(&f, &sys, 0, 1, 1, z, z + 1, sn, tape, w) == ROLN_E_RANGE);
    CHECK(sn[0] == 0 && sn[1] == 0);
    s[0] = s[1] = 0;
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 0, 1, 1, s, sn, tape, w) == ROLN_OK);
    fresh_done();
}

/* The backward of a midpoint step makes ROLN_MIDPOINT_ITERS iterations, no more and no less: M = 1, V = 0 and the spring
   tau = -3 z at rest with h = 1, where the iteration of mu contracts by 3/4 and is far from its end after ten. */
static void test_iterations(uint64_t *seed)
{
    const roln_lnn f = shape(1, 0, 2, 1, 0);
    const roln_real w[2] = {0, -3}, gsn[2] = {1, ROLN_C(0.5)}, s[2] = {0, 0};
    roln_real *th = weights(&f, seed), sn[2], gs[2] = {0, 0}, gw[2] = {0, 0}, *tape, *work;
    spring sp = {1, NULL, NULL};
    roln_force fc;
    roln_system sys;
    ld mu = 0;
    int i;
    for (i = 0; i < roln_lnn_params(&f); i++) th[i] = 0;
    sp.w = w, sp.gw = gw;
    fc.eval = spring_eval, fc.bwd = spring_bwd, fc.jac = spring_jac, fc.ctx = &sp, fc.jac_zd = NULL;
    sys.theta = th, sys.force = &fc;
    m.kind = ROLN_MIDPOINT;
    tape = fresh(tape_of(1, 1)), work = fresh(ROLN_MAX(work_of(1, 1), back_work_of(1)));
    CHECK(roln_lnn_step(&f, &sys, ROLN_MIDPOINT, 1, 1, 1, s, sn, tape, work) == ROLN_OK);
    roln_lnn_step_bwd(&f, &sys, ROLN_MIDPOINT, 1, 1, gsn, gs, NULL, tape, work);
    for (i = 0; i < ROLN_MIDPOINT_ITERS; i++) /* mu <- g_z+ + dS/dz_m / 2 with dS/dz_m = -3 (g_p+ + mu / 2) */
        mu = 1 - 1.5L * (0.5L + mu / 2);
    BOUND("midpoint backward: iterations, z (eps)", fabsl((ld)gs[0] - (1 - 3 * (0.5L + mu / 2))) / EPS, 8);
    BOUND("midpoint backward: iterations, zd (eps)", fabsl((ld)gs[1] - (0.5L + mu)) / EPS, 8);
    fresh_done();
}

/* ---- scratch ---- */

/* A map writes its tapes and its work, forward and back, up to the last number of the declared sizes. */
static void check_room(roln_lnn f, int kind, int keep, int nb, uint64_t *seed)
{
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, kind, nb, 1, seed), g = zero_inputs();
    roln_real *out = fresh(2 * nb * f.n), *tape = fresh(tape_of(keep, nb)), *work = fresh(work_of(keep, nb));
    if (kind == ROLN_MIDPOINT) m.h = (ld)ROLN_C(1e-3); /* any of the shapes converges */
    CHECK(run(&x, keep, nb, out, room_of(tape_of(keep, nb)), work) == ROLN_OK);
    CHECK_ROOM();
    CHECK(run(&x, keep, nb, out, tape, room_of(work_of(keep, nb))) == ROLN_OK);
    CHECK_ROOM();
    if (keep) {
        back(&x, nb, tape, &g, room_of(back_work_of(nb)));
        CHECK_ROOM();
    }
    fresh_done();
}

static void check_terms_room(roln_lnn f, uint64_t *seed)
{
    roln_real *th = weights(&f, seed);
    const inputs x = draw(&f, th, ZDD, 1, 0, seed);
    roln_real *X = fresh(f.n * f.n + 3 * f.n + 2), *tape = fresh(TAPE(1, 0, 1)), *work = fresh(TERMS_WORK);
    CHECK(terms(th, x.s, -1, X, room_of(TAPE(1, 0, 1)), work) == ROLN_OK);
    CHECK_ROOM();
    CHECK(terms(th, x.s, -1, X, tape, room_of(TERMS_WORK)) == ROLN_OK);
    CHECK_ROOM();
    fresh_done();
}

static void check_rooms(roln_lnn f, int nb, uint64_t *seed)
{
    static const int kinds[] = {ZDD, INVERSE, START, ROLN_EULER, ROLN_RK4, ROLN_MIDPOINT, ROLN_LEAPFROG};
    int i;
    for (i = 0; i < 12; i++) check_room(f, kinds[i / 2], i % 2, nb, seed);
    check_room(f, INVERSE_W, 0, nb, seed);
    if (nb == 1) check_terms_room(f, seed);
}

static void test_rooms(uint64_t *seed)
{
    int i, nb;
    for (nb = 1; nb <= 5; nb += 4) {
        for (i = 0; i < VARIANTS; i++) check_rooms(variant(i), nb, seed);
        for (i = 0; i < 2; i++) { /* perceptrons of one to four hidden layers, narrow and wide, and wider than anything else */
            check_rooms(shape(4, i, 2, 1, 0), nb, seed), check_rooms(shape(1, i, 2, 9, 0), nb, seed);
            check_rooms(shape(3, i, 3, 9, 2), nb, seed), check_rooms(shape(3, i, 3, 2, 9), nb, seed);
            check_rooms(damped(shape(3, i, 4, 3, 6)), nb, seed), check_rooms(damped(shape(2, i, 5, 5, 2)), nb, seed);
            check_rooms(shape(2, i, 3, 20, 20), nb, seed), check_rooms(damped(shape(5, i, 3, 2, 1)), nb, seed);
        }
        check_rooms(cholesky(shape(4, 0, 3, 2, 3)), nb, seed), check_rooms(damped(cholesky(shape(4, 0, 2, 8, 0))), nb, seed);
        check_rooms(behind(shape(4, 0, 3, 2, 5), 2), nb, seed), check_rooms(behind(shape(4, 1, 2, 9, 0), 1), nb, seed);
    }
}

void TEST_NAME(lnn_edges)(void)
{
    uint64_t seed = 21;
    int i;
    test_status(&seed);
    test_identity(&seed);
    test_edge(&seed);
    test_iterations(&seed);
    test_rooms(&seed);
    for (i = VARIANTS; i < ALL; i++) check_rooms(variant(i), 1, &seed), check_rooms(variant(i), 5, &seed);
    print_bounds();
}
