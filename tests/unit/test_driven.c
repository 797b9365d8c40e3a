/* SPDX-License-Identifier: MIT */
/* Driven joints (ROLN_DRIVEN): a step against the equations with unknown forces on them, solved as they stand; every derivative
   against differences; the same motion as under the force that drives them; a pendulum on a moving base; losses, control and the
   guard; joints in units of their own; parameters of another number of driven joints are refused. Behind a chart: driven joints are
   coordinates, in every fit, and a mass between two held ends is learned. A held joint that does not move is refused. */

#include "check.h"

/* A pendulum on a base that moves: angle, position of the base. */
#define ROLN_NAME pendulum
#define ROLN_AE 2
#define ROLN_MLP 16
#define ROLN_ANGLES 1, 0
#define ROLN_DRIVEN 1
#include "roln.h"

/* Five markers of which the last is held, on a surface of two coordinates. */
#define ROLN_NAME held_end
#define ROLN_AE 5, 2
#define ROLN_MLP 16
#define ROLN_CHART polynomial, 2
#define ROLN_DRIVEN 1
#define ROLN_GN_ROWS 8
#include "roln.h"

#define OF_DRIVEN
/* The same with joints in units of their own. */
#define CALLED(X) X(reduce) X(lift) X(step) X(linear)
#define SMALL(name) name##_own
#define SMALL_SCALE each
#include "small_models.h"
#undef CALLED
#define CALLED(X) \
    X(encode) X(decode) X(step) X(linear) X(dynamics) X(reduce) X(lift) X(control) X(grad) X(grad_acc) X(rows) X(inverse) \
    X(allocate) X(fit_inertia) X(force_variance) X(gains) X(push) X(slopes)
#define SMALL_ROWS 3
#define SMALL_LEARN everything
#include "small.h"
#include "samples.h"
#include "differences.h"
#include "units.h"

void TEST_NAME(driven)(void);

static int driven_of(int k)
{
    return models[k]->md->lnn.driven;
}

/* tau_z from inputs in user's units: J^T of forces; accelerations over the derivative of their joint. */
static void force_of(int k, const instance *m, const roln_real *z, const roln_real *zd, const roln_real *u, ld *tau_z)
{
    const int n = n_OF(k), N = N_OF(k);
    roln_real q[MAXN], column[MAXN], e[MAXN];
    int i, j;
    (void)zd;
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) e[j] = i == j;
        CHECK_OK(m->of->decode(m, z, e, q, column, ROOM(decode)));
        for (tau_z[i] = 0, j = 0; j < N - driven_of(k); j++) tau_z[i] += (ld)column[j] * (ld)u[j];
        if (i >= n - driven_of(k)) tau_z[i] = (ld)u[N - n + i] / (ld)column[N - n + i];
        for (j = N - driven_of(k); j < N; j++) CHECK(j - N == i - n || all(1, column + j, 0));
    }
}

/* The force that the model without driven joints needs for a motion moves it so; and lift and reduce are the units of tau. */
static void test_prescribed(int k, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int n = n_OF(k);
    const roln_motors motors = {1, theta_k, 1};
    roln_real s[3 * MAXN], tau[MAXN], tau_z[MAXN], back[MAXN], a[MAXN];
    ld zdd[MAXN], wide[MAXN] = {0};
    int i;
    dyadic(3 * n, 1, seed, s), dyadic(N_OF(k), 1, seed, tau);
    CHECK_OK(m.of->reduce(&m, s, tau, tau_z, ROOM(reduce)));
    force_of(k, &m, s, s + n, tau, wide);
    BOUND("tau_z, eps", distance(n, tau_z, wide) / EPS, 4);
    CHECK_OK(m.of->lift(&m, s, tau_z, back, ROOM(lift)));
    force_of(k, &m, s, s + n, back, wide);
    if (k != CABLE) BOUND("lift, eps", distance(n, tau_z, wide) / EPS, 4); /* its pair is not quite one: test_held_ends */
    widen(driven_of(k), tau + N_OF(k) - driven_of(k), wide);
    BOUND("accelerations, eps", distance(driven_of(k), back + N_OF(k) - driven_of(k), wide) / EPS, 4);
    CHECK(m.of->allocate(&m, s, &motors, tau_z, back, NULL, ROOM(allocate)) == ROLN_E_LENGTH);
    CHECK_OK(m.of->inverse(&m, s, s + n, NULL, s + 2 * n, a, ROOM(inverse)));
    for (i = 0; i < n; i++) wide[i] = i < n - driven_of(k) ? (ld)a[i] : (ld)s[2 * n + i];
    slow_motion(k, &m, s, s + n, wide, driven_of(k), zdd);
    widen(n, s + 2 * n, wide);
    for (i = 0; i < n; i++) a[i] = (roln_real)zdd[i];
    BOUND("the motion that it is driven to, eps", distance(n, a, wide) / EPS, 40);
}

/* PD+ with the acceleration that the drives are told: zdd of the free joints is that of the reference less feedback. */
static void test_control_driven(int k, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int n = n_OF(k), free = n - driven_of(k);
    roln_real s[2 * MAXN], r[3 * MAXN], zero[MAXN] = {0}, tau_z[MAXN], got[MAXN];
    const target_at still = {s, s + n, r, zero, zero, NULL}, to = {r, r + n, r + 2 * n, r, r, NULL}; /* gains: any numbers */
    ld wide[MAXN] = {0}, zdd[MAXN];
    int i;
    dyadic(2 * n, 1, seed, s), dyadic(3 * n, 1, seed, r);
    CHECK_OK(m.of->control(&m, s, s + n, &still, tau_z, ROOM(control))); /* no error: inverse dynamics */
    widen(n, tau_z, wide);
    slow_motion(k, &m, s, s + n, wide, driven_of(k), zdd);
    for (i = 0; i < n; i++) got[i] = (roln_real)zdd[i];
    widen(n, r, wide);
    BOUND("zdd of the reference, eps", distance(n, got, wide) / EPS, 100);
    CHECK_OK(m.of->control(&m, s, s + n, &to, tau_z, ROOM(control)));
    for (i = free; i < n; i++) {
        const ld e = difference(k, i, (ld)s[i], (ld)r[i]), ed = (ld)s[n + i] - (ld)r[n + i];
        const ld want = (ld)r[2 * n + i] - (ld)r[i] * (e + ed);
        CHECK_NEAR((double)tau_z[i], (double)want, 16 * (double)ROLN_EPS * (1 + fabs((double)want)));
    }
}

/* The acceleration and the force loss by their definitions: with the accelerations of the recording as inputs, those of the driven
   joints are 0, and the forces on them are not compared. */
static void test_losses(int k, uint64_t *seed)
{
    static data d;
    static gradient g;
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int n = n_OF(k), N = N_OF(k), free = n - driven_of(k);
    const ld time4 = (ld)m.scale->t * (ld)m.scale->t * (ld)m.scale->t * (ld)m.scale->t;
    ld acceleration = 0, force = 0;
    roln_real inertia = 1, variance[MAXN];
    int w, i, j;
    make(k, ACC, 4, seed, &d);
    for (w = 0; w < 4; w++) {
        roln_real z[MAXN], zd[MAXN], goal[MAXN], M[64], c[MAXN], gr[MAXN], dm[MAXN];
        const terms_at out = {M, c, gr, dm, NULL, NULL};
        const roln_real *qdd = d.qdd + w * N;
        ld tau_z[MAXN], zdd[MAXN];
        for (i = N - driven_of(k); i < N; i++) d.tau[w * N + i] = qdd[i];
        CHECK_OK(m.of->encode(&m, d.q + w * N, qdd, z, goal, ROOM(encode))); /* it is linear */
        CHECK_OK(m.of->encode(&m, d.q + w * N, d.qd + w * N, z, zd, ROOM(encode)));
        force_of(k, &m, z, zd, d.tau + w * N, tau_z);
        slow_motion(k, &m, z, zd, tau_z, driven_of(k), zdd);
        CHECK_OK(m.of->dynamics(&m, z, zd, &out, ROOM(dynamics)));
        for (i = 0; i < free; i++) {
            ld r = (ld)c[i] + (ld)gr[i] + (ld)dm[i] - tau_z[i];
            for (j = 0; j < n; j++) r += (ld)M[i * n + j] * (ld)goal[j];
            force += r * r * time4;
            acceleration += (zdd[i] - (ld)goal[i]) * (zdd[i] - (ld)goal[i]) * time4;
        }
    }
    CHECK_OK(grad_of(&m, &d, &g));
    BOUND("acceleration loss, eps", fabsl((ld)g.t.term[ZDD] - acceleration) / acceleration / EPS, 20);
    BOUND("force loss, eps", fabsl((ld)g.t.term[FORCE] - force) / force / EPS, 20);
    CHECK_OK(m.of->fit_inertia(&m, &d.b, &inertia, ROOM(fit_inertia)));
    CHECK_OK(m.of->force_variance(&m, &d.b, variance, ROOM(force_variance)));
    CHECK(inertia > 0 && variance[0] > 0 && variance[n - 1] > 0);
    make(k, VAR, 3, seed, &d);
    CHECK(grad_of(&m, &d, &g) == ROLN_E_LENGTH); /* not from positions alone */
}

/* Gains of driven joints are accelerations: those of their coordinates, and none of the others. */
static void test_gains_driven(int k, uint64_t *seed)
{
    const instance m = trained(models[k], scale_of(k), theta_k);
    const int n = n_OF(k), N = N_OF(k), D = driven_of(k);
    roln_real z[MAXN], Kp[MAXN], Kd[MAXN], kp[MAXN], kd[MAXN], again[MAXN];
    dyadic(n, 1, seed, z), dyadic(N, 1, seed, Kp), dyadic(N, 1, seed, Kd);
    CHECK_OK(m.of->gains(&m, z, Kp, Kd, kp, kd, ROOM(gains)));
    CHECK(same(D, kp + n - D, Kp + N - D) && same(D, kd + n - D, Kd + N - D));
    Kp[N - 1] = 100;
    CHECK_OK(m.of->gains(&m, z, Kp, Kd, again, kd, ROOM(gains)));
    CHECK(same(n - 1, again, kp));
}

/* Inputs x [N] of the model with joints in common units for the one with own units: forces over each, accelerations times each. */
static void drives_in_units(const pair *p, const roln_real *x, roln_real *y)
{
    int j;
    for (j = 0; j < p->N; j++) y[j] = j < p->N - driven_of(p->k) ? x[j] / p->each[j] : x[j] * p->each[j];
}

/* Units that are powers of two give the bits of joints that were scaled by hand. */
static void test_own_units(int k, uint64_t *seed)
{
    static pair p;
    static twice x;
    roln_real s[2 * MAXN], u[2][MAXN], by[MAXN];
    int i, n, N;
    pair_of(k, seed, &p), n = p.n, N = p.N;
    dyadic(2 * n, ROLN_C(0.5), seed, s), dyadic(N, 1, seed, u[0]), drives_in_units(&p, u[0], u[1]);
    make_twice(&p, s, u, &x);
    fill(MAXN, 1, by), drives_in_units(&p, by, by), drives_in_units(&p, x.lifted[0], x.lifted[0]);
    for (i = 0; i < 2 * n * N; i++) x.B[1][i] *= by[i % N]; /* by inputs of the first */
    CHECK(same(n, x.tau_z[0], x.tau_z[1]) && same(N, x.lifted[0], x.lifted[1]) && same(2 * n, x.s[0], x.s[1]));
    CHECK(same(4 * n * n, x.A[0], x.A[1]) && same(2 * n * N, x.B[0], x.B[1]));
}

/* ---- behind a chart ----------------------------------------------------------------------------- */

enum { SEEN = 600 };
static roln_real held_q[5 * SEEN], held_qd[5 * SEEN], held_qdd[5 * SEEN];

/* Joints x = a y + b y^2 + c d + e y d of y, and the held one d; their velocities and accelerations. */
static void markers(double y, double yd, double ydd, double d, double dd, double ddd, roln_real *q, roln_real *qd, roln_real *qdd)
{
    static const double a[4] = {1, 0.75, -0.5, 0.25}, b[4] = {0.1, 0.2, 0.3, -0.1};
    static const double c[4] = {0.25, 0.5, 3, 1}, e[4] = {0.1, -0.1, 0.2, 0};
    int i;
    for (i = 0; i < 4; i++) {
        const double slope = a[i] + 2 * b[i] * y + e[i] * d;
        q[i] = (roln_real)(a[i] * y + b[i] * y * y + c[i] * d + e[i] * y * d);
        qd[i] = (roln_real)(slope * yd + (c[i] + e[i] * y) * dd);
        qdd[i] = (roln_real)(slope * ydd + 2 * b[i] * yd * yd + 2 * e[i] * yd * dd + (c[i] + e[i] * y) * ddd);
    }
    q[4] = (roln_real)d, qd[4] = (roln_real)dd, qdd[4] = (roln_real)ddd;
}

/* The last coordinate is the held joint, in a unit of its own, to the bit: columns of Phi and W, the row of Psi. */
static void check_held(const held_end_params *p, double bound)
{
    static held_end_decode_work dw;
    static held_end_encode_work ew;
    const roln_real *phi = p->theta, *psi = phi + 10, *W = psi + 15;
    static held_end_state x, back;
    static held_end_latent s;
    int i, j;
    CHECK(phi[4] == 0 && all(4, psi + 5, 0) && psi[9] > 0);
    CHECK_NEAR((double)(psi[9] * phi[9]), 1, (double)ROLN_EPS);
    for (i = 0; i < held_end_monomials; i++) CHECK(W[i * 5 + 4] == 0);
    for (i = 0; i < 2; i++)
        for (j = 0; j < 2; j++) CHECK_NEAR((double)roln_dot(5, psi + 5 * i, phi + 5 * j), i == j, 40 * (double)ROLN_EPS);
    for (i = 0; i < SEEN; i++) {
        for (j = 0; j < 5; j++) x.q[j] = held_q[5 * i + j], x.qd[j] = held_qd[5 * i + j];
        CHECK_OK(held_end_encode(p, &x, &s, &ew));
        CHECK_OK(held_end_decode(p, &s, &back, &dw));
        CHECK_NEAR((double)back.q[4], (double)x.q[4], 8 * (double)ROLN_EPS);
        CHECK_NEAR((double)back.qd[4], (double)x.qd[4], 8 * (double)ROLN_EPS * (1 + fabs((double)x.qd[4])));
        for (j = 0; j < 4; j++) BOUND("joints of the surface", fabsl((ld)back.q[j] - (ld)x.q[j]), bound);
    }
}

/* The chart of joints of which one is driven, through every fit; training leaves it as it is; force and acceleration are lifted. */
static void test_held_ends(void)
{
    static held_end_params p, kept;
    static held_end_start w;
    static held_end_refinement turn;
    static held_end_chart sums;
    static held_end_gradient g;
    static held_end_optimiser o;
    static held_end_grad_acc_work gw;
    static held_end_update_work u;
    static held_end_lift_work lw;
    static held_end_reduce_work rw;
    const roln_opt opt = ROLN_OPT(ROLN_C(1e-2), ROLN_C(1e-2));
    const roln_loss wt = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0};
    roln_real qbar[5], left = 1, tau[5], tau_z[2] = {ROLN_C(0.5), -2}, again[2];
    held_end_latent s;
    roln_batch b;
    uint64_t seed = 11;
    int i, it;
    CHECK_OK(held_end_init(&p, &seed, &w.init));
    CHECK(all(4, p.theta + 15, 0) && p.theta[19] == 1 && p.theta[9] == 1 && p.theta[4] == 0);
    for (i = 0; i < SEEN; i++) {
        const double y = 2 * roln_uniform(&seed) - 1, d = 2 * roln_uniform(&seed) - 1;
        markers(y, roln_normal(&seed), 0, d, roln_normal(&seed), 0, held_q + 5 * i, held_qd + 5 * i, held_qdd + 5 * i);
    }
    CHECK_OK(held_end_init_pod(&p, SEEN, held_q, held_qd, qbar, &seed, &w.init_pod));
    check_held(&p, 10);
    memset(&b, 0, sizeof b), memset(&turn, 0, sizeof turn), memset(&sums, 0, sizeof sums);
    b.count = SEEN, b.stride = 1, b.q = held_q, b.qd = held_qd, b.qdd = held_qdd;
    for (it = 0; it < 60 && held_end_chart_refine(&p, &b, &turn, &left) == ROLN_OK; it++)
        if (it % 10 == 0) check_held(&p, 10);
    BOUND("what the chart leaves, of sqrt(ridge)", (ld)left / sqrtl((ld)ROLN_CHART_RIDGE), sizeof(roln_real) == 4 ? 30 : 3);
    check_held(&p, 1e-3);
    CHECK_OK(held_end_chart_add(&p, SEEN, held_q, &sums, &w.chart_add));
    CHECK_OK(held_end_chart_solve(&p, &sums, ROLN_CHART_RIDGE, &left, &w.chart_solve));
    check_held(&p, 1e-3);
    kept = p;
    memset(&o, 0, sizeof o), memset(&g, 0, sizeof g);
    CHECK_OK(held_end_grad_acc(&p, &wt, &b, &g, &gw));
    CHECK_OK(held_end_update(&p, &opt, &o, &g, &u));
    CHECK(same(held_end_ae_size, p.theta, kept.theta) && !same(held_end_theta_size, p.theta, kept.theta));
    s.z[0] = ROLN_C(0.25), s.z[1] = ROLN_C(0.5), s.zd[0] = s.zd[1] = 0;
    CHECK_OK(held_end_lift(&p, &s, tau_z, tau, &lw));
    CHECK_OK(held_end_reduce(&p, &s, tau, again, &rw));
    for (i = 0; i < 2; i++) CHECK_NEAR((double)again[i], (double)tau_z[i], 100 * (double)ROLN_EPS);
}

/* A held joint that does not move does not show how the others follow it. The start refuses it. So does a step of the fit, which
   leaves the model as it was. */
static void test_still(void)
{
    enum { FEW = 4, ROWS = 64 };
    static held_end_params p, was;
    static held_end_start w;
    static held_end_refinement turn;
    static const double still[4] = {0.5, 0, 0.3, -7};
    roln_real qbar[5], left = 7;
    roln_batch b;
    uint64_t seed = 13;
    int i, k;
    memset(&b, 0, sizeof b);
    b.count = FEW, b.stride = 1, b.q = held_q, b.qd = held_qd;
    for (i = 0; i < ROWS; i++) {
        const double y = 2 * roln_uniform(&seed) - 1, d = 2 * roln_uniform(&seed) - 1;
        markers(y, roln_normal(&seed), 0, d, roln_normal(&seed), 0, held_q + 5 * i, held_qd + 5 * i, held_qdd + 5 * i);
    }
    CHECK_OK(held_end_init_pod(&p, ROWS, held_q, held_qd, qbar, &seed, &w.init_pod));
    was = p, memset(&turn, 0, sizeof turn);
    CHECK_OK(held_end_chart_refine(&p, &b, &turn, &left)); /* as many samples are enough if it moves */
    CHECK(left < 7 && !same(held_end_ae_size, p.theta, was.theta));
    for (k = 0; k < 4; k++) {
        for (i = 0; i < ROWS; i++) {
            const double y = 2 * roln_uniform(&seed) - 1;
            markers(y, roln_normal(&seed), 0, still[k], 0, 0, held_q + 5 * i, held_qd + 5 * i, held_qdd + 5 * i);
        }
        p = was, left = 7, memset(&turn, 0, sizeof turn);
        CHECK(held_end_chart_refine(&p, &b, &turn, &left) == ROLN_E_ILL_CONDITIONED);
        CHECK(all(1, &left, 7) && memcmp(&p, &was, sizeof p) == 0);
        CHECK(held_end_init_pod(&p, ROWS, held_q, held_qd, qbar, &seed, &w.init_pod) == ROLN_E_ILL_CONDITIONED);
        CHECK(all(held_end_theta_size, p.theta, 0)); /* it holds no model */
    }
}

#ifdef ROLN_DOUBLE
/* The y of a mass that a spring holds at d: y'' = -4 sin(y - d) - d'' / 2. */
static double acceleration(double y, double d, double ddd)
{
    return -4 * sin(y - d) - ddd / 2;
}

/* The mass between ends that move is learned from its accelerations: y'' at states and accelerations that it has not seen. */
static void test_mass(void)
{
    static held_end_params p;
    static held_end_start w;
    static held_end_refinement turn;
    static held_end_gradient g;
    static held_end_optimiser o;
    static held_end_grad_acc_work gw;
    static held_end_update_work u;
    static held_end_encode_work ew;
    static held_end_decode_work dw;
    static held_end_step_work sw;
    static double tau[5 * SEEN];
    const roln_loss wt = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0};
    roln_opt opt = ROLN_OPT(1e-2, 1e-2);
    double qbar[5], left, off = 0, all_of_it = 0;
    roln_batch b;
    uint64_t seed = 12;
    int i, j, it;
    for (i = 0; i < SEEN; i++) {
        const double y = 2 * roln_uniform(&seed) - 1, d = 2 * roln_uniform(&seed) - 1, ddd = 2 * roln_normal(&seed);
        markers(y, roln_normal(&seed), acceleration(y, d, ddd), d, roln_normal(&seed), ddd, held_q + 5 * i, held_qd + 5 * i,
                held_qdd + 5 * i);
        tau[5 * i + 4] = ddd;
    }
    CHECK_OK(held_end_init_pod(&p, SEEN, held_q, held_qd, qbar, &seed, &w.init_pod));
    memset(&b, 0, sizeof b), memset(&turn, 0, sizeof turn), memset(&o, 0, sizeof o);
    b.count = SEEN, b.stride = 1, b.q = held_q, b.qd = held_qd, b.qdd = held_qdd, b.tau = tau;
    for (it = 0; it < 60 && held_end_chart_refine(&p, &b, &turn, &left) == ROLN_OK; it++) {}
    for (it = 0; it < 1500; it++) {
        opt.lr[1] = it < 1000 ? 1e-2 : 1e-3;
        memset(&g, 0, sizeof g);
        CHECK_OK(held_end_grad_acc(&p, &wt, &b, &g, &gw));
        CHECK_OK(held_end_update(&p, &opt, &o, &g, &u));
    }
    for (i = 0; i < 100; i++) {
        const double y = 1.8 * roln_uniform(&seed) - 0.9, d = 1.8 * roln_uniform(&seed) - 0.9, yd = roln_normal(&seed), h = 1e-5;
        const double a[5] = {0, 0, 0, 0, 2 * roln_normal(&seed)};
        held_end_state x, next;
        held_end_latent s;
        double qdd[5];
        markers(y, yd, acceleration(y, d, a[4]), d, 0.5, a[4], x.q, x.qd, qdd);
        CHECK_OK(held_end_encode(&p, &x, &s, &ew));
        CHECK_OK(held_end_step(&p, &s, a, h, &sw));
        CHECK_OK(held_end_decode(&p, &s, &next, &dw));
        CHECK_NEAR(next.qd[4], 0.5 + h * a[4], 1e-12);
        for (j = 0; j < 4; j++) {
            const double error = (next.qd[j] - x.qd[j]) / h - qdd[j];
            off += error * error, all_of_it += qdd[j] * qdd[j];
        }
    }
    BOUND("acceleration of a mass between held ends", sqrt(off / all_of_it), 0.05);
}
#endif

/* Bytes and text name the driven joints; those of a model without them are refused. */
static void test_kept(void)
{
    static pendulum_params p, q;
    static pendulum_init_work w;
    static unsigned char bytes[pendulum_packed_size];
    static char text[TEXT];
    roln_model other = pendulum_model;
    uint64_t seed = 5;
    CHECK_OK(pendulum_init(&p, &seed, &w));
    pendulum_pack(&p, bytes);
    CHECK_OK(pendulum_unpack(pendulum_packed_size, bytes, &q));
    CHECK(memcmp(&p, &q, sizeof p) == 0);
    other.lnn.driven = 0;
    CHECK(roln_unpack(&other, pendulum_packed_size, bytes, &q) == ROLN_E_FORMAT);
    other.lnn.driven = 2;
    CHECK(roln_unpack(&other, pendulum_packed_size, bytes, &q) == ROLN_E_SHAPE);
    CHECK_OK(pendulum_write(&p, put_text, text));
    CHECK(strstr(text, "pendulum_weights_are_of_ROLN_DRIVEN_1[pendulum_driven == 1 ?") != NULL);
}

/* A tick gives the acceleration of the base. The guard does not know the power of its drive. */
static void test_guard_driven(void)
{
    static pendulum_params p;
    static pendulum_init_work w;
    static pendulum_tick_work work;
    pendulum_guard g;
    pendulum_target r;
    pendulum_latent s;
    const pendulum_state x = {{ROLN_C(0.125), ROLN_C(0.25)}, {0, 0}};
    roln_limits l;
    uint64_t seed = 6;
    CHECK_OK(pendulum_init(&p, &seed, &w));
    memset(&l, 0, sizeof l), memset(&g, 0, sizeof g), memset(&r, 0, sizeof r);
    fill(2, -1, p.z_min), fill(2, 1, p.z_max), fill(2, 1, p.zd_max);
    l.dt = ROLN_C(0.01), l.tau = 100, l.hold = 3;
    r.zdd[1] = ROLN_C(0.5);
    CHECK(pendulum_tick(&p, &l, &x, &r, &s, &g, &work) == 0);
    CHECK_NEAR((double)g.tau[1], 0.5, 1e-6);
    l.residual = 1;
    CHECK(pendulum_tick(&p, &l, &x, &r, &s, &g, &work) == ROLN_FAULT_INPUT);
}

/* Limits from recordings: all but the residual, and no rate of false alarms. */
static void test_limits_driven(void)
{
    enum { COUNT = 40 };
    static pendulum_params p;
    static pendulum_start start;
    static pendulum_train w;
    roln_real q[2 * COUNT], qd[2 * COUNT], tau[2 * COUNT], most[2], rate[2];
    const roln_batch b = {.count = 1, .steps = COUNT - 1, .stride = 1, .q = q, .qd = qd, .tau = tau};
    roln_limits l = {.dt = ROLN_C(0.01), .hold = 3}, before;
    uint64_t seed = 6;
    int i;
    CHECK_OK(pendulum_init(&p, &seed, &start.init));
    fill(2, -ROLN_C(0.25), p.z_min), fill(2, ROLN_C(0.25), p.z_max), fill(2, 1, p.zd_max);
    for (i = 0; i < 2 * COUNT; i++)
        q[i] = (roln_real)(0.5 * sin(0.2 * i)), qd[i] = (roln_real)(0.5 * cos(0.2 * i)), tau[i] = (roln_real)sin(0.3 * i);
    CHECK_OK(pendulum_fit_limits(&p, &b, 2, &l, most, rate, &w.fit_limits));
    CHECK(l.residual <= 0 && l.margin > ROLN_C(0.5) && most[0] > 1 && rolni_limits_valid(&l, 2));
    l.false_alarms = ROLN_C(0.01), before = l;
    CHECK(pendulum_fit_limits(&p, &b, 2, &l, most, rate, &w.fit_limits) == ROLN_E_RANGE);
    CHECK(memcmp(&l, &before, sizeof l) == 0);
}

#ifdef ROLN_DOUBLE
/* A pendulum of length 1 under g = 4 whose base moves as it is told: theta'' = -4 sin theta - a cos theta. Learned from its
   accelerations, it falls as it should from states and under accelerations that it has not seen. */
static void test_pendulum(void)
{
    enum { SAMPLES = 400 };
    static pendulum_params p;
    static pendulum_init_work start;
    static pendulum_gradient g;
    static pendulum_optimiser o;
    static pendulum_grad_acc_work w;
    static pendulum_update_work u;
    static pendulum_step_work sw;
    static double q[2 * SAMPLES], qd[2 * SAMPLES], qdd[2 * SAMPLES], tau[2 * SAMPLES];
    const roln_loss wt = {0, 0, 0, 0, 0, 1, 0, 0, 0, 0};
    roln_opt opt = ROLN_OPT(1e-2, 1e-2);
    roln_batch b;
    uint64_t seed = 9;
    double off = 0;
    int i, it;
    CHECK_OK(pendulum_init(&p, &seed, &start));
    for (i = 0; i < SAMPLES; i++) {
        q[2 * i] = 6.28 * roln_uniform(&seed), q[2 * i + 1] = roln_normal(&seed);
        qd[2 * i] = roln_normal(&seed), qd[2 * i + 1] = roln_normal(&seed);
        tau[2 * i] = 0, tau[2 * i + 1] = 2 * roln_normal(&seed);
        qdd[2 * i] = -4 * sin(q[2 * i]) - tau[2 * i + 1] * cos(q[2 * i]), qdd[2 * i + 1] = tau[2 * i + 1];
    }
    memset(&b, 0, sizeof b), memset(&o, 0, sizeof o);
    b.count = SAMPLES, b.stride = 1, b.q = q, b.qd = qd, b.qdd = qdd, b.tau = tau;
    CHECK_OK(pendulum_ignore(&p, 1)); /* the base may be anywhere */
    for (it = 0; it < 1500; it++) {
        opt.lr[1] = it < 1000 ? 1e-2 : 1e-3;
        memset(&g, 0, sizeof g);
        CHECK_OK(pendulum_grad_acc(&p, &wt, &b, &g, &w));
        CHECK_OK(pendulum_update(&p, &opt, &o, &g, &u));
    }
    for (i = 0; i < 100; i++) {
        pendulum_latent s;
        const double th = 6.28 * roln_uniform(&seed), a[2] = {0, 2 * roln_normal(&seed)}, h = 1e-4;
        double error;
        s.z[0] = th, s.z[1] = 3, s.zd[0] = 1, s.zd[1] = 0;
        CHECK_OK(pendulum_step(&p, &s, a, h, &sw));
        error = (s.zd[0] - 1) / h - (-4 * sin(th) - a[1] * cos(th));
        off += error * error / 100;
        CHECK_NEAR(s.zd[1], h * a[1], 1e-15);
    }
    BOUND("acceleration of the pendulum, of 3.2", sqrt(off), 0.05);
}
#endif

void TEST_NAME(driven)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        uint64_t s = 900 + (uint64_t)k;
        parameters(k, &s, theta_k);
        check_step(k, driven_of(k), force_of, &s);
        test_prescribed(k, &s);
        test_control_driven(k, &s);
        test_gains_driven(k, &s);
        test_losses(k, &s);
        check_slopes(k, &s);
        test_own_units(k, &s);
#ifdef ROLN_DOUBLE
        check_jacobian(models[k], scale_of(k), &s);
        check_gradient(k, ODE, &s);
        check_gradient(k, ACC, &s);
        check_gradient(k, ACC_STARTS, &s);
        check_rows(k, ODE, &s);
        check_rows(k, ACC, &s);
#endif
    }
    test_kept();
    test_guard_driven();
    test_limits_driven();
    test_held_ends();
    test_still();
#ifdef ROLN_DOUBLE
    test_pendulum();
    test_mass();
#endif
    print_bounds();
}
