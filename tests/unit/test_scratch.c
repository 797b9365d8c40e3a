/* SPDX-License-Identifier: MIT */
/* Sizes of a model: those that the compiler knows are those that the functions of the kernels find; and scratch is exact: the
   hungriest call of every function of prediction and control writes all of the scratch that its type declares. Of training:
   test_scratch_training.c. */
#define CALLED(X) \
    X(encode) X(encode_reference) X(decode) X(step) X(linear) X(reduce) X(lift) X(dynamics) X(inverse) X(inertia) \
    X(control) X(gains) \
    X(allocate) X(guard_tick) X(tick) X(lqr) X(lqr_along) X(filter_tick) X(plan_next) X(plan_linear) X(fit_range)
#include "small.h"
#include "scratch.h"

void TEST_NAME(scratch)(void);

/* ---- sizes ------------------------------------------------------------------------------------ */

/* The sizes that size macros ask for, as a model gives them: NAME_N, NAME_n .. */
#define SIZES(X, of) \
    X(of, N) X(of, N1) X(of, N2) X(of, n) X(of, ae_sum) X(of, monomials) X(of, bent) X(of, ae_size) X(of, keeps) X(of, inputs) \
    X(of, force_size) X(of, scheme) X(of, base) X(of, damping) X(of, damper) X(of, friction) X(of, cossin) \
    X(of, cholesky) X(of, cols) X(of, outputs) X(of, formed) X(of, layers) \
    X(of, polynomials) X(of, hidden) X(of, hidden_v) X(of, wide) X(of, wide_v) X(of, back) X(of, back_v) X(of, planes_1) \
    X(of, planes_2) X(of, planes_3) \
    X(of, row_mass) X(of, row_dm) X(of, row_bwd) X(of, row_bwd_0) X(of, row_bwd_1) X(of, row_bwd_2) X(of, row_jac_1) \
    X(of, row_jac_2) X(of, row_mass_0) X(of, row_gradient_0) X(of, row_gradient_1) X(of, row_all_0) X(of, row_all_1)
#define SIZE_FIELD(of, name) int name;
#define SIZE_VALUE(of, name) .name = of##_##name,
typedef struct {
    SIZES(SIZE_FIELD, )
} sizes;
#define SIZES_OF(of) {SIZES(SIZE_VALUE, of)}
static const sizes sizes_of[MODELS] = {
    SIZES_OF(plain), SIZES_OF(bare),    SIZES_OF(square), SIZES_OF(deep),   SIZES_OF(pole),  SIZES_OF(rich),  SIZES_OF(delan),
    SIZES_OF(pushed), SIZES_OF(layered), SIZES_OF(chart),  SIZES_OF(curved), SIZES_OF(wheel), SIZES_OF(laden),
    SIZES_OF(rubbed), SIZES_OF(bowl),    SIZES_OF(gantry),
};
#define OF_Z(name) z.name

/* The sizes known to the compiler are those that the functions find at run time. */
static void test_sizes(int k)
{
    const model *mo = models[k];
    const roln_model *md = mo->md;
    const roln_lnn *f = &md->lnn;
    const roln_mlp *net = &f->mass_net, *of_v = &f->potential_net;
    const sizes z = sizes_of[k];
    int numbers = 0, moments = 0, i, nb, dirs, keep;
    for (i = 0; i < mo->blocks; i++)
        numbers += roln_block_size(mo->table + i), moments += roln_block_moments(mo->table + i);
    CHECK(numbers == mo->params && moments == mo->moments && mo->params == roln_params(md));
    CHECK(z.N == md->ae.size[0] && z.N1 == roln_ae_width(&md->ae, 1) && z.N2 == roln_ae_width(&md->ae, 2));
    CHECK(z.n == f->n && z.n == md->ae.size[md->ae.layers]);
    CHECK(z.ae_sum == roln_ae_sum(&md->ae) && z.ae_size == roln_ae_params(&md->ae) && z.keeps == md->ae.keeps);
    CHECK(z.monomials == md->ae.monomials && z.bent == roln_ae_bent(&md->ae) && (z.monomials > 0) == (md->ae.degree > 0));
    CHECK(z.inputs == md->inputs && z.force_size == roln_force_size(md) && z.scheme == md->scheme);
    CHECK(z.layers == f->layers && z.base == f->base && z.damping == f->damping && z.formed == rolni_formed(f));
    CHECK(z.friction == f->friction && z.damper == (f->damping ? f->damper_net.size[f->damper_net.layers] : 0));
    CHECK(z.cossin == rolni_cossin(f));
    CHECK(z.hidden == roln_mlp_hidden(net) && z.wide == roln_mlp_widest(net, 0) + roln_mlp_widest(net, 1));
    CHECK(z.hidden_v == roln_mlp_hidden(of_v) && z.wide_v == roln_mlp_widest(of_v, 0) + roln_mlp_widest(of_v, 1));
    CHECK(z.polynomials == (net->degree > 0) && z.polynomials == (of_v->degree > 0));
    CHECK(z.outputs == net->size[net->layers] && z.cols == (f->squares > 0 ? f->squares : f->n));
    CHECK(ROLNI_CHAIN(OF_Z, 0) == rolni_chain_size(f, 0) && ROLNI_CHAIN(OF_Z, 2) == rolni_chain_size(f, 2));
    for (nb = 1; nb < 4; nb++) {
        for (dirs = 1; dirs <= 2; dirs++)
            for (keep = 0; keep < 2; keep++)
                CHECK(ROLN_LNN_TAPE(OF_Z, dirs, keep, nb) == roln_lnn_tape(f, dirs, keep, nb));
    }
    i = k == POLE || md->ae.layers + f->layers + f->base == 0; /* no block has scratch, and an array has one number at least */
    CHECK_NEAR(roln_update_work(mo->blocks, mo->table), mo->scratch.update, i);
}

static void test_shapes(void)
{
    CHECK(plain_N == 6 && plain_n == 2 && plain_ae_layers == 2);
    CHECK(bare_N == 3 && bare_n == 3 && bare_ae_layers == 0);
    CHECK(deep_n == 2 && deep_ae_layers == 8 && deep_mlp_layers == 6 && pole_n == 1);
    CHECK(sizeof(plain_params) == sizeof(roln_real) * (6 + 6 + plain_theta_size));
    CHECK(plain_model.scheme == ROLN_RK4 && bare_model.scheme == ROLN_MIDPOINT && square_model.scheme == ROLN_EULER);
}

/* ---- scratch is exact ------------------------------------------------------------------------- */

#define RUNS(X) \
    X(encode) X(encode_reference) X(decode) X(step) X(linear) X(reduce) X(lift) X(dynamics) X(inverse) X(inertia) \
    X(control) X(gains) \
    X(allocate) X(guard_tick) X(tick) X(lqr) X(lqr_along) X(filter_tick) X(plan_next) X(plan_linear) X(fit_range)

static void use_tick(int k, const instance *m, const roln_real *x)
{
    const int N = N_OF(k), n = n_OF(k);
    static const roln_motors damped = {.mu = 1};
    roln_limits limits = {.dt = dt, .margin = 1, .residual = 100, .tau = 100, .hold = 1, .q_tolerance = 1e6f, .qd_tolerance = 1e6f,
                          .motors = m->of->md->inputs > 0 ? &damped : NULL, .evidence = all_known(), .novelty = ROLN_C(1e30)};
    const target_at target = {.z = x, .zd = x + n, .zdd = x + 2 * n, .kp = x + 3 * n, .kd = x + 4 * n};
    roln_real z[MAXN], zd[MAXN], zdd[MAXN], q[MAXN], qd[MAXN], tau_z[MAXN], tau[MAXN] = {0};
    roln_guard guard = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0};
    const guard_at held = {&guard, tau};
    const roln_motors motors = {ROLN_MIN(3, N), x, 1};
    int i;
    USE(encode, m->of->encode(m, x, x + N, z, zd, work));
    USE(encode_reference, m->of->encode_reference(m, x, x + N, x, z, zd, zdd, work));
    USE(decode, m->of->decode(m, z, zd, q, qd, work));
    USE(control, m->of->control(m, z, zd, &target, tau_z, work));
    USE(lift, m->of->lift(m, z, tau_z, q, work));
    USE(gains, m->of->gains(m, z, x, x, z, zd, work));
    USE(allocate, m->of->allocate(m, z, &motors, tau_z, q, NULL, work));
    for (i = 0; i < 2; i++)
        USE(guard_tick, (m->of->guard_tick(m, &limits, x, x + N, z, zd, x, &held, work), ROLN_OK));
    for (i = 0; i < 2; i++)
        USE(tick, (m->of->tick(m, &limits, x, x + N, &target, z, zd, &held, work), ROLN_OK));
    limits.motors = m->of->md->inputs > 0 ? &damped : &motors;
    USE(tick, (m->of->tick(m, &limits, x, x + N, &target, z, zd, &held, work), ROLN_OK));
    CHECK(guard.valid || m->of->md->inputs > 0); /* that is, the balance was computed */
}

static void use_lqr(int k, const instance *m, const roln_real *x)
{
    static roln_real w[MAXN], K[2 * MAXN * 2 * MAXN], P[4 * MAXN * MAXN], s[6 * MAXN];
    static roln_real u[MAXN];
    const roln_cost cost = {w, w, u, dt, NULL};
    const int n2 = 2 * n_OF(k);
    fill(MAXN, 1, w), fill(MAXN, k == DEEP ? ROLN_C(1e8) : 1, u);
    memcpy(s, x, (size_t)n2 * sizeof *s), memcpy(s + n2, s, (size_t)n2 * sizeof *s), memcpy(s + 2 * n2, s, (size_t)n2 * sizeof *s);
    USE(lqr, m->of->lqr(m, &cost, s, NULL, K, P, work));
    USE(lqr_along, m->of->lqr_along(m, &cost, 2, s, NULL, P, K, work));
    USE(lqr_along, m->of->lqr_along(m, &cost, 2, s, NULL, NULL, K, work));
}

static void use_plan(int k, const instance *m, const roln_real *x)
{
    static roln_real w[MAXN], u[MAXN], A[16 * MAXN * MAXN], B[8 * MAXN * MAXN], c[8 * MAXN];
    static roln_real path[10 * MAXN], torque[4 * MAXN], K[8 * MAXN * MAXN];
    const int motors = models[k]->motors;
    const roln_motors two = {motors, x, 0};
    const roln_limits limits = {.dt = dt, .margin = 1, .tau = 1, .rate = 8, .motors = m->of->md->inputs > 0 ? NULL : &two};
    const roln_term term[2] = {{.of = ROLN_OF_Q, .weight = w, .ref = x}, {.of = ROLN_OF_QD, .weight = w, .ref = x}};
    const roln_goal goal = {.dt = dt, .terms = 2, .term = term, .u = u, .limits = &limits};
    roln_plan plan = {0, 0, 0, 0};
    const plan_at pl = {&plan, path, torque, K};
    fill(MAXN, 1, w), fill(MAXN, k == DEEP ? ROLN_C(1e8) : 1, u);
    USE(plan_next, m->of->plan_next(m, &goal, x, &pl, work));
    USE(plan_linear, m->of->plan_linear(m, &goal, &pl, A, B, c, work));
}

/* A start and a tick. */
static void use_filter(int k, const instance *m, const roln_real *x)
{
    static roln_real F[9 * MAXN * MAXN];
    const int N = N_OF(k);
    roln_noise noise = {.dt = dt, .q = 1, .tau = 1, .load = 1};
    roln_real z[MAXN], zd[MAXN], load[MAXN];
    roln_filter filter = {0, 0, 0, 0, 0, 0, 0};
    const filter_at e = {&filter, z, zd, F, models[k]->load ? load : NULL, NULL};
    int i;
    for (i = 0; i < 2; i++)
        USE(filter_tick, (m->of->filter_tick(m, &noise, x + i * N, x, &e, work), filter.valid ? ROLN_OK : ROLN_E_RANGE));
}

static void use_mechanics(int k, const instance *m, const roln_real *x)
{
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[MAXN], zd[MAXN], y[MAXN], A[256], B[256], M[64], c[MAXN], g[MAXN], d[MAXN], T = 0, V = 0;
    const terms_at out = {M, c, g, d, &T, &V};
    int force, i;
    for (force = 0; force < 2; force++) {
        memcpy(z, x, sizeof z), memcpy(zd, x + MAXN, sizeof zd);
        USE(step, m->of->step(m, z, zd, force ? x : NULL, dt / 8, work));
        USE(linear, m->of->linear(m, z, zd, force ? x : NULL, dt / 8, A, B, work));
        USE(inverse, m->of->inverse(m, z, zd, force ? x : NULL, x, y, work));
    }
    USE(reduce, m->of->reduce(m, z, x, y, work));
    USE(dynamics, m->of->dynamics(m, z, zd, &out, work));
    USE(inertia, m->of->inertia(m, z, x, y, work));
    USE(fit_range, m->of->fit_range(m, 3, x, x + 3 * N, y, c, g, work));
    for (i = 0; i < n; i++)
        CHECK(y[i] <= c[i]);
}

static void test_scratch(int k)
{
    static roln_real theta[MAXP], x[256];
    roln_real low[MAXN], high[MAXN];
    const instance m = {models[k], scale_of(k), low, high, high, theta, NULL};
    fill(MAXN, -100, low), fill(MAXN, 100, high);
    (void)scratch_start(k, theta, x);
    use_tick(k, &m, x);
    use_lqr(k, &m, x);
    use_plan(k, &m, x);
    use_filter(k, &m, x);
    use_mechanics(k, &m, x);
    RUNS(CHECK_EXACT)
}

void TEST_NAME(scratch)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_sizes(k);
        test_scratch(k);
    }
    test_shapes();
}
