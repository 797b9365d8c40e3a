/* SPDX-License-Identifier: MIT */
/* A model at work (roln.h): the functions of one model are those of the kernels in its units; updates that stay on their
   manifolds; 200 updates that learn, and what a failure leaves; arguments and settings that make no sense; numbers of statuses.
   The parts: test_gradient.c, test_rows.c, test_measures.c, test_pack.c, test_scratch.c. */
#define CALLED(X) X(grad) X(grad_acc)
#include "small.h"
#include "samples.h"

void TEST_NAME(roln)(void);

static const roln_loss ode_weights = ROLN_ODE_WEIGHTS, acc_weights = ROLN_ACC_WEIGHTS;
enum { MAXE = 10 };

/* ---- updates ---------------------------------------------------------------------------------- */

/* What others keep in files and logs: the numbers of a status do not change. */
static void test_statuses(void)
{
    CHECK(ROLN_OK == 0 && ROLN_E_NOT_FINITE == -1 && ROLN_E_NOT_SPD == -2 && ROLN_E_NO_CONVERGENCE == -3);
    CHECK(ROLN_E_ILL_CONDITIONED == -4 && ROLN_E_RANGE == -5 && ROLN_E_LENGTH == -6 && ROLN_E_FORMAT == -7);
    CHECK(ROLN_E_PRECISION == -8 && ROLN_E_SHAPE == -9 && ROLN_E_CHECKSUM == -10);
}

/* The parameters are on their manifolds: Psi^T Phi = I; P and the biases of gyro layers are SPD. */
static void check_manifolds(int k, const roln_real *theta)
{
    const roln_model *md = models[k]->md;
    const roln_lnn *f = &md->lnn;
    roln_real L[64];
    int l, i, j, p, at = 0;
    for (l = 0; l < md->ae.layers; l++) { /* Phi^T, Psi^T [n][N] each */
        const int N = md->ae.size[l], n = md->ae.size[l + 1];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                ld sum = -(ld)(i == j);
                for (p = 0; p < N; p++)
                    sum += (ld)theta[at + i * N + p] * (ld)theta[at + n * N + j * N + p];
                BOUND("constraint, eps", fabsl(sum) / EPS, 20);
            }
        at += 2 * n * N + N;
    }
    for (l = -1; l < f->layers; l++) {
        const int base = l < 0, w = f->n;
        const roln_real *X = theta + at + (base ? rolni_base_at(f) : rolni_layer_at(f, l) + ROLN_TRI(w));
        if (base && !f->base) continue;
        CHECK_OK(roln_chol(w, X, L));
        for (i = 0; i < w * w; i++)
            CHECK(same(1, X + i, X + i % w * w + i / w));
    }
}

static const roln_opt adam_options = {.lr = {ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)},
                                      .beta1 = ROLN_C(0.9), .beta2 = ROLN_C(0.999), .eps = ROLN_C(1e-8), .clip = 5};

/* Updates from real gradients keep every model on its manifolds and change every block of it; a refused one changes nothing. */
static void test_update(int k)
{
    static data d;
    static roln_real theta[MAXP], first[MAXP], was[MAXP], m[MAXP], v[MAXP], v_max[MAXP];
    static gradient g;
    const roln_model *md = models[k]->md;
    const instance mo = trained(models[k], scale_of(k), theta);
    const roln_moments moments = {m, v, v_max};
    const int params = models[k]->params, input_at = params - N_OF(k) * md->inputs;
    roln_adam adam, adam_was;
    uint64_t s = 100 + (uint64_t)k;
    int round, i, at = 0;
    memset(&adam, 0, sizeof adam), fill(MAXP, 0, m), fill(MAXP, 0, v), fill(MAXP, 0, v_max);
    CHECK_OK(roln_ae_init(&md->ae, theta, &s, ROOM(init)));
    roln_lnn_init(&md->lnn, theta + roln_ae_params(&md->ae), &s);
    dyadic(N_OF(k) * md->inputs, 1, &s, theta + input_at);
    memcpy(first, theta, sizeof theta);
    for (round = 0; round < 6; round++) {
        const int refused = round == 3;
        roln_status st;
        make(k, round % 2 ? ODE : ACC, 4, &s, &d);
        d.h = dt / 8;
        CHECK_OK(grad_of(&mo, &d, &g));
        memcpy(was, theta, sizeof was), adam_was = adam;
        if (refused) g.theta[params - 1] = (roln_real)NAN;
        st = roln_adam_update(models[k]->blocks, models[k]->table, &adam_options, 1 / (roln_real)4, g.theta, theta, &adam, &moments,
                              ROOM(update));
        ROOM_KEPT();
        CHECK(st == (refused ? ROLN_E_NOT_FINITE : ROLN_OK));
        if (refused) CHECK(same(params, was, theta) && memcmp(&adam, &adam_was, sizeof adam) == 0);
    }
    check_manifolds(k, theta);
    for (i = 0; i < models[k]->blocks; i++) {
        const int size = roln_block_size(models[k]->table + i);
        CHECK(size == 0 || !same(size, theta + at, first + at));
        at += size;
    }
}

/* ---- arguments that make no sense ------------------------------------------------------------- */

/* Settings of an update that make no sense: a status, and nothing moves. */
static void test_settings(void)
{
    static plain_params p, p0;
    static plain_optimiser o, o0;
    static plain_gradient g;
    static plain_train train;
    static plain_start start;
    uint64_t seed = 15;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start.init));
    g.windows = 1, p0 = p, o0 = o;
    for (i = 0; i < 6; i++) {
        roln_opt opt = ROLN_OPT(ROLN_C(0.01), ROLN_C(0.01));
        if (i < 3) opt.lr[i] = i == 1 ? -1 : (roln_real)NAN;
        if (i == 3) opt.clip = (roln_real)NAN;
        if (i == 4) opt.decay = (roln_real)INFINITY;
        if (i == 5) opt.lr[0] = (roln_real)INFINITY;
        CHECK(plain_update(&p, &opt, &o, &g, &train.update) == ROLN_E_NOT_FINITE);
        CHECK(memcmp(&p, &p0, sizeof p) == 0 && memcmp(&o, &o0, sizeof o) == 0);
    }
}

/* A status each, and nothing is written. Long: a line for each argument. */
static void test_arguments(void)
{
    static const struct {
        int count, steps, stride;
    } wrong[5] = {
        {.count = 2, .steps = -40, .stride = 1},
        {.count = 2, .steps = -1, .stride = 1},
        {.count = 2, .steps = 1, .stride = 0},
        {.count = 2, .steps = 1, .stride = -3},
        {.count = -1, .steps = 1, .stride = 1},
    };
    static plain_params p;
    static plain_train train;
    static plain_start start;
    static plain_work work;
    static plain_gradient g;
    static data d;
    uint64_t seed = 14;
    roln_error e[3 * MAXE], sevens = {7, 7, 7, 7};
    const roln_errors out = {e, e + MAXE, e + 2 * MAXE};
    roln_real u[4], tau_z[2] = {1, 1}, *numbers = (roln_real *)(void *)&g;
    plain_latent s = {{0, 0}, {0, 0}};
    terms var;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start.init));
    make(PLAIN, ODE, 2, &seed, &d), d.b.qdd = d.qdd;
    fill(plain_theta_size + TERMS + 1, 7, numbers), fill(TERMS, 7, var.term), fill(4, 7, u);
    for (i = 0; i < 3 * MAXE; i++)
        e[i] = sevens;
    p.slope /= 2; /* numbers of another config */
    CHECK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train.grad) == ROLN_E_SHAPE);
    CHECK(plain_grad_acc(&p, &acc_weights, &d.b, &g, &train.grad_acc) == ROLN_E_SHAPE);
    CHECK(plain_variance(&p, &d.b, &var.loss, &train.variance) == ROLN_E_SHAPE);
    CHECK(plain_fit_inertia(&p, &d.b, &train.fit_inertia) == ROLN_E_SHAPE);
    CHECK(plain_force_variance(&p, &d.b, u, &train.force_variance) == ROLN_E_SHAPE);
    CHECK(plain_errors(&p, &d.b, dt, 1, d.q, &out, &train.errors) == ROLN_E_SHAPE);
    p.slope *= 2;
    for (i = 0; i < 5; i++) {
        roln_batch b = d.b;
        b.count = wrong[i].count, b.steps = wrong[i].steps, b.stride = wrong[i].stride;
        CHECK(plain_grad(&p, &ode_weights, &b, dt, &g, &train.grad) == ROLN_E_LENGTH);
        CHECK(plain_grad_acc(&p, &acc_weights, &b, &g, &train.grad_acc) == ROLN_E_LENGTH);
        CHECK(plain_variance(&p, &b, &var.loss, &train.variance) == ROLN_E_LENGTH);
        CHECK(plain_fit_inertia(&p, &b, &train.fit_inertia) == ROLN_E_LENGTH);
        CHECK(plain_force_variance(&p, &b, u, &train.force_variance) == ROLN_E_LENGTH);
        CHECK(plain_errors(&p, &b, dt, 1, d.q, &out, &train.errors) == ROLN_E_LENGTH);
        b.qd = NULL;
        CHECK(plain_grad(&p, &ode_weights, &b, dt, &g, &train.grad) == ROLN_E_LENGTH);
    }
    for (i = 0; i > -3; i--)
        CHECK(plain_errors(&p, &d.b, dt, i, d.q, &out, &train.errors) == ROLN_E_LENGTH);
    for (i = -1; i <= 0; i++) /* motors */
        CHECK(plain_allocate(&p, &s, &(roln_motors){i, d.q, 1}, tau_z, u, NULL, &work.allocate) == ROLN_E_LENGTH);
    d.b.count = 0; /* no windows: no variance, and nothing to add */
    CHECK(plain_variance(&p, &d.b, &var.loss, &train.variance) == ROLN_E_LENGTH);
    CHECK_OK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train.grad));
    CHECK_OK(plain_grad_acc(&p, &acc_weights, &d.b, &g, &train.grad_acc));
    d.b.count = 1, d.b.steps = plain_horizon + 1;
    CHECK(plain_grad(&p, &ode_weights, &d.b, dt, &g, &train.grad) == ROLN_E_LENGTH);
    CHECK(all(plain_theta_size + TERMS + 1, numbers, 7) && all(TERMS, var.term, 7) && all(4, u, 7));
    CHECK(sizeof g == 2 * sizeof(roln_real) * (plain_theta_size + TERMS + 1) && p.scale.m == 1);
    for (i = 0; i < 3 * MAXE; i++)
        CHECK(memcmp(&e[i], &sevens, sizeof sevens) == 0);
}

/* ---- a model at work -------------------------------------------------------------------------------- */

/* Scratch of a function, and not a number more. */
#define PLAIN_WORK(member) ((plain_##member##_work *)(void *)room_of(NUMBERS_OF(plain_work, member)))
#define PLAIN_TRAIN(member) ((plain_##member##_work *)(void *)room_of(NUMBERS_OF(plain_train, member)))

static void check_in_range(const plain_params *p, const plain_latent *corner)
{
    plain_latent s = *corner;
    CHECK(plain_in_range(p, &s));
    s.z[1] = p->z_max[1] + 1;
    CHECK(!plain_in_range(p, &s));
    s.z[1] = (roln_real)NAN;
    CHECK(!plain_in_range(p, &s));
    s.z[1] = p->z_max[1];
    CHECK(plain_in_range(p, &s));
    s.zd[1] *= 1 + 4 * ROLN_EPS;
    CHECK(!plain_in_range(p, &s));
    s.zd[1] = (roln_real)NAN;
    CHECK(!plain_in_range(p, &s));
}

/* Of a model without a range nothing is within it, not even the pose 0 at rest; one whose coordinates rested has one. */
static void check_no_range(const plain_params *p)
{
    static plain_params none;
    plain_latent s;
    none = *p;
    memset(&s, 0, sizeof s);
    memset(none.z_min, 0, sizeof none.z_min), memset(none.z_max, 0, sizeof none.z_max), memset(none.zd_max, 0, sizeof none.zd_max);
    CHECK(!plain_in_range(&none, &s) && !plain_i_in_range(&none, 1000, s.z, s.zd));
    none.z_max[1] = 1;
    CHECK(plain_in_range(&none, &s));
    none.z_max[1] = 0, none.zd_max[0] = 1;
    CHECK(plain_in_range(&none, &s));
}

/* Forces and terms of a model are those of the kernels, in its units: with q = s phi(z), t = c t' and a unit m of inertia,
       tau' = tau s c^2 / m,  M = M' m,  c, g = m c', m g' / c^2,  T = m T' (kernels: '). */
static void check_kernels(const plain_params *p, const plain_latent *s, const roln_real *tau)
{
    static roln_real tape[1000], work[1000];
    const roln_ae *ae = &plain_model.ae;
    const roln_real unit_of_it = p->scale.m, time = p->scale.t, time2 = time * time;
    roln_real tau_z[2], back[2], x[6], y[6], lifted[6], state[4], M[4], c[2], g[2], T, V, zero[2] = {0, 0};
    const roln_dynamics_out out = {M, c, g, NULL, &T, &V};
    plain_equation e;
    int i;
    memset(&e, 0, sizeof e);
    CHECK_OK(plain_reduce(p, s, tau, tau_z, PLAIN_WORK(reduce)));
    ROOM_KEPT();
    CHECK_OK(plain_lift(p, s, tau_z, lifted, PLAIN_WORK(lift)));
    ROOM_KEPT();
    roln_ae_decode(ae, 1, 1, p->theta, s->z, x, tape);
    roln_ae_reduce(ae, 1, p->theta, tape, tau, y, work);
    for (i = 0; i < 2; i++)
        CHECK_NEAR(tau_z[i], y[i] * p->scale.q, 40 * EPS * largest(2, tau_z));
    roln_ae_lift_tape(ae, 1, 1, tape, tape);
    roln_ae_lift(ae, 1, p->theta, tape, tau_z, y, work);
    for (i = 0; i < 6; i++)
        CHECK_NEAR(lifted[i], y[i] / p->scale.q, 40 * EPS * largest(6, lifted));
    CHECK_OK(plain_reduce(p, s, lifted, back, PLAIN_WORK(reduce)));
    CHECK_BELOW(furthest(2, back, tau_z), 200 * EPS * largest(2, tau_z)); /* J^T D^T = I */
    CHECK_OK(plain_dynamics(p, s, &e, PLAIN_WORK(dynamics)));
    ROOM_KEPT();
    for (i = 0; i < 2; i++)
        state[i] = s->z[i], state[2 + i] = time * s->zd[i];
    CHECK_OK(roln_lnn_dynamics(&plain_model.lnn, p->theta + plain_ae_size, state, &out, tape, work));
    for (i = 0; i < 4; i++)
        CHECK_NEAR(e.M[i], unit_of_it * M[i], 4 * EPS * largest(4, e.M));
    for (i = 0; i < 2; i++) {
        CHECK_NEAR(e.c[i], unit_of_it / time2 * c[i], 8 * EPS * largest(2, e.c));
        CHECK_NEAR(e.g[i], unit_of_it / time2 * g[i], 8 * EPS * largest(2, e.g));
    }
    CHECK_NEAR(e.T, unit_of_it / time2 * T, 8 * EPS * (ld)e.T);
    CHECK_NEAR(e.V, unit_of_it / time2 * V, 8 * EPS * fabsl((ld)e.V));
    CHECK(same(2, e.d, zero) && ROLN_ABS(e.M[1] - e.M[2]) <= 0);
}

/* Every function of a model where it is at work. */
static void test_shell(void)
{
    enum { COUNT = 4, ALL = COUNT * plain_N };
    static plain_params p;
    static plain_gradient g;
    static plain_start start;
    roln_real q[ALL], qd[ALL], qdd[ALL], tau[ALL];
    roln_batch b = {.count = COUNT, .steps = 0, .stride = 1, .q = q, .qd = qd, .qdd = qdd, .tau = tau};
    plain_latent s;
    uint64_t seed = 9;
    int i;
    CHECK_OK(plain_init(&p, &seed, &start.init));
    for (i = 0; i < ALL; i++) {
        q[i] = roln_normal(&seed) / 4;
        qd[i] = roln_normal(&seed), qdd[i] = roln_normal(&seed), tau[i] = roln_normal(&seed);
    }
    CHECK_OK(plain_fit_range(&p, COUNT, q, qd, PLAIN_TRAIN(fit_range)));
    ROOM_KEPT();
    memcpy(s.z, p.z_min, sizeof s.z), s.zd[0] = p.zd_max[0], s.zd[1] = -p.zd_max[1];
    check_in_range(&p, &s);
    check_no_range(&p);
    s.zd[1] = -1;
    p.scale.q = 2, p.scale.t = ROLN_C(0.5), p.scale.m = 4;
    check_kernels(&p, &s, tau);
    p.scale.q = p.scale.t = p.scale.m = 1;
    CHECK_OK(plain_grad_acc(&p, &acc_weights, &b, &g, PLAIN_TRAIN(grad_acc)));
    ROOM_KEPT();
    CHECK_NEAR(roln_loss_total(&acc_weights, &g.loss), g.loss.q + g.loss.qd + g.loss.qdd + g.loss.zdd + g.loss.qdd_pred,
               8 * EPS * (ld)roln_loss_total(&acc_weights, &g.loss));
}

/* Two oscillators seen through six channels. */
enum { SAMPLES = 400 };
static void oscillators(roln_real *q, roln_real *qd)
{
    int k, c;
    for (k = 0; k < SAMPLES; k++)
        for (c = 0; c < 6; c++) {
            const double a = cos(k * 0.05), ad = -sin(k * 0.05), b = sin(k * 0.07 + 1), bd = 1.4 * cos(k * 0.07 + 1);
            const double e = 0.1 * (c - 2.5), f = 0.3 * (c % 3 - 1), odd = c % 2;
            q[k * 6 + c] = (roln_real)(e * a + f * b + 0.1 * a * a * odd);
            qd[k * 6 + c] = (roln_real)(e * ad + f * bd + 0.2 * a * ad * odd);
        }
}

/* A trained model packed and unpacked, and that its autoencoder is a projection still. */
static void check_trained(plain_params *p, const roln_real *q, const roln_real *qd, roln_real h)
{
    static plain_params again;
    static plain_work work;
    static plain_train train;
    static unsigned char bytes[plain_packed_size];
    plain_state x, y;
    plain_latent z;
    int i;
    CHECK(plain_fit_range(p, SAMPLES, q, qd, &train.fit_range) == ROLN_OK && p->z_min[0] < p->z_max[0]);
    p->dt = h;
    plain_pack(p, bytes);
    memset(&again, 0, sizeof again);
    CHECK(plain_unpack(plain_packed_size, bytes, &again) == ROLN_OK && memcmp(p, &again, sizeof *p) == 0);
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    CHECK_OK(plain_encode(p, &x, &z, &work.encode));
    CHECK_OK(plain_decode(p, &z, &y, &work.decode));
    x = y;
    CHECK_OK(plain_encode(p, &x, &z, &work.encode));
    CHECK_OK(plain_decode(p, &z, &y, &work.decode));
    for (i = 0; i < 6; i++)
        CHECK_NEAR(x.q[i], y.q[i], 60 * EPS), CHECK_NEAR(x.qd[i], y.qd[i], 200 * EPS);
}

/* 200 updates. */
static void test_training(void)
{
    enum { H = 4, BATCH = 8 };
    static const roln_opt opt = {.lr = {ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)},
                                 .beta1 = ROLN_C(0.9), .beta2 = ROLN_C(0.999), .eps = ROLN_C(1e-8), .clip = 5};
    static roln_real q[SAMPLES * 6], qd[SAMPLES * 6], qbar[6];
    static plain_params p, was;
    static plain_optimiser o, o_was;
    static plain_gradient g;
    static plain_start init;
    const roln_real h = ROLN_C(0.05);
    uint64_t s = 3;
    int start[BATCH], k, i;
    double first = 0, last = 0;
    roln_error e[2];
    roln_batch b = {.count = BATCH, .steps = H, .stride = 1, .start = start, .q = q, .qd = qd};
    oscillators(q, qd);
    for (k = 0; k < 2; k++) { /* what was there before does not show: with 0xff it is what it is with 0 */
        plain_params *at = k ? &was : &p;
        memset(at, k ? 0xff : 0, sizeof *at), s = 2;
        CHECK_OK(plain_init(at, &s, &init.init));
    }
    CHECK(memcmp(&p, &was, sizeof p) == 0);
    for (k = 0; k < 2; k++) {
        plain_params *at = k ? &was : &p;
        memset(at, k ? 0xff : 0, sizeof *at), s = 3;
        CHECK_OK(plain_init_pod(at, SAMPLES, q, qd, qbar, &s, &init.init_pod));
    }
    CHECK(memcmp(&p, &was, sizeof p) == 0);
    for (k = 0; k < 200; k++) {
        for (i = 0; i < BATCH; i++)
            start[i] = roln_randint(SAMPLES - H, &s);
        memset(&g, 0, sizeof g);
        CHECK_OK(plain_grad(&p, &ode_weights, &b, h, &g, PLAIN_TRAIN(grad)));
        ROOM_KEPT();
        CHECK_OK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)));
        ROOM_KEPT();
        if (k < 10) first += (double)roln_loss_total(&ode_weights, &g.loss);
        if (k >= 190) last += (double)roln_loss_total(&ode_weights, &g.loss);
    }
    BOUND("loss, last / first", (ld)(last / first), 0.1);
    /* failures leave everything, bytes and back, errors, range */
    was = p, o_was = o;
    g.theta[5] = (roln_real)NAN;
    CHECK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)) == ROLN_E_NOT_FINITE);
    memset(&g, 0, sizeof g);
    CHECK(plain_update(&p, &opt, &o, &g, PLAIN_TRAIN(update)) == ROLN_E_NOT_FINITE); /* no windows */
    CHECK(memcmp(&p, &was, sizeof p) == 0 && memcmp(&o, &o_was, sizeof o) == 0);
    b.steps = H + 1;
    CHECK(plain_grad(&p, &ode_weights, &b, h, &g, PLAIN_TRAIN(grad)) == ROLN_E_LENGTH);
    b.steps = 40, b.count = 4, start[0] = 0, start[1] = 90, start[2] = 180, start[3] = 270;
    CHECK_OK(plain_errors(&p, &b, h, 40, qbar, &(roln_errors){e, NULL, NULL}, PLAIN_TRAIN(errors)));
    ROOM_KEPT();
    CHECK_BELOW(sqrt((double)(e[1].q / e[1].q_var)), 0.9);
    check_trained(&p, q, qd, h);
}

/* What the linear start refuses: no sample, and samples of a machine that stands. It then holds no model. */
static void test_no_start(void)
{
    static plain_params p;
    static plain_start w;
    static roln_real q[4 * plain_N], qd[4 * plain_N];
    static const plain_params none;
    roln_real qbar[plain_N];
    uint64_t s = 4;
    int k;
    for (k = 0; k < 2; k++) {
        CHECK_OK(plain_init(&p, &s, &w.init));
        fill(4 * plain_N, 3, q), fill(4 * plain_N, 0, qd);
        CHECK(plain_init_pod(&p, 4 * k, q, qd, qbar, &s, &w.init_pod) == (k ? ROLN_E_NOT_FINITE : ROLN_E_LENGTH));
        CHECK(memcmp(p.theta, none.theta, sizeof p.theta) == 0 && plain_params_mismatch(&p));
    }
}

void TEST_NAME(roln)(void)
{
    int k;
    for (k = 0; k < MODELS; k++)
        test_update(k);
    test_statuses();
    test_settings();
    test_arguments();
    test_shell();
    test_training();
    test_no_start();
    print_bounds();
}
