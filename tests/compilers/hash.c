/* SPDX-License-Identifier: MIT */
/* hash.c - the promise of equal bits, as four lines. The first: FNV-1a 64 over the little-endian bits of parameters and optimiser
   state after 200 training steps, then of z, zd, q, qd after each of 1000 steps of a roll-out; then the same of a model with
   every option, trained with all three losses, of its controller and linearisation, of a chart in closed form, of SPD
   maps and distances, of denormal numbers, of a large symmetric system, of Gauss-Newton, which goes on from a copy as if it had not
   stopped, of a machine that turns round and rubs, with its feedback, plans, the ticks of its one motor and a filter, and of
   polynomials. Before the lines it writes its packed parameters; what it goes on with are those that it then reads. See hash.sh.
   Three more parts of the machine that turns round have a line each. `doubt` is evidence, deviations and the covariance of a
   roll-out. `alarms` is limits of the guard from recordings, novelty and energy residuals. `tightened` is plans with soft limits
   that are tightened and with a reserve of torque. */
#define ROLN_NAME net
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 16, 16
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "roln.h"

#define ROLN_NAME full
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 8, 8
#define ROLN_INTEGRATOR midpoint
#define ROLN_BASE 1
#define ROLN_LAYERS gyro, gyro
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "roln.h"

#define ROLN_NAME curved
#define ROLN_AE 6, 4, 2
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 8, 8
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "roln.h"

#define ROLN_NAME pupil /* 33 parameters: a system of these, and one of 4 rows */
#define ROLN_AE 6, 1
#define ROLN_MLP 2
#define ROLN_BASE 1
#define ROLN_HORIZON 2
#define ROLN_BLOCK 1
#define ROLN_GN_ROWS 40
#define ROLN_LEARN everything
#include "roln.h"

#define ROLN_NAME wheel
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_ANGLES 0, 1
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_PLAN 8, 1
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "roln.h"

#define ROLN_NAME crane /* polynomials of a slider and a hinge; a mass matrix of squares */
#define ROLN_AE 2
#define ROLN_POLYNOMIALS 2, 3
#define ROLN_MASS squares, 3
#define ROLN_ANGLES 0, 1
#define ROLN_DAMPING 1
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "roln.h"

#include "examples/firmware/text.h"

enum { SAMPLES = 512, BATCH = 8, H = 4, UPDATES = 200, STEPS = 1000 };

/* The hashes, a line each. Numbers are added to the one of number `line`. */
enum { FIRST, DOUBT, ALARMS, TIGHTENED, LINES };
static uint64_t hash[LINES] = {ROLN_FNV, ROLN_FNV, ROLN_FNV, ROLN_FNV};
static int line = FIRST;

/* Scratch: of one model, or of the large system, at a time, so that all fit into the 512 kB of a microcontroller. */
enum { SIDE = 70 };
static union {
    net_train net;
    full_train full;
    curved_train curved;
    pupil_train pupil;
    wheel_train wheel;
    crane_train crane;
    roln_real sums[ROLN_SYM_WORK], chol[ROLN_SYM_CHOL_WORK(SIDE)];
} train;

static void add(int n, const roln_real *x)
{
    unsigned char b[sizeof(roln_real)], *p;
    for (; n > 0; n--, x++) {
        p = b;
        rolni_put(&p, rolni_bits(*x), sizeof b);
        hash[line] = roln_fnv(sizeof b, b, hash[line]);
    }
}

static void add_double(int n, const double *x)
{
    unsigned char b[8], *p;
    for (; n > 0; n--, x++) {
        uint64_t bits;
        memcpy(&bits, x, sizeof bits);
        p = b;
        rolni_put(&p, bits, 8);
        hash[line] = roln_fnv(8, b, hash[line]);
    }
}

static void add_integer(uint32_t x)
{
    unsigned char b[4], *p = b;
    rolni_put(&p, x, sizeof b);
    hash[line] = roln_fnv(sizeof b, b, hash[line]);
}

static void must(roln_status st, const char *what)
{
    if (st == ROLN_OK) return;
    put_text(what);
    put_text(": status -");
    put_integer((uint32_t)-st, 0);
    put_text("\n");
    board_exit(1);
}

/* Two oscillators, stepped by + and *, seen through six channels with a little of their product. */
static void record(uint64_t *s, roln_real h, roln_real *q, roln_real *qd)
{
    roln_real a[2] = {1, ROLN_C(0.5)}, v[2] = {0, 1}, w2[2] = {1, 2}, mix[6][3];
    int k, c, i;
    for (c = 0; c < 18; c++) mix[c / 3][c % 3] = roln_normal(s) * (c % 3 == 2 ? ROLN_C(0.125) : ROLN_C(0.5));
    for (k = 0; k < SAMPLES; k++) {
        for (c = 0; c < 6; c++, q++, qd++) {
            *q = mix[c][0] * a[0] + mix[c][1] * a[1] + mix[c][2] * (a[0] * a[1]);
            *qd = mix[c][0] * v[0] + mix[c][1] * v[1] + mix[c][2] * (a[0] * v[1] + v[0] * a[1]);
        }
        for (i = 0; i < 2; i++) {
            v[i] -= h / 2 * w2[i] * a[i];
            a[i] += h * v[i];
            v[i] -= h / 2 * w2[i] * a[i];
        }
    }
}

/* Every option at once; a random torque as the input. */
static void hash_full(const roln_real *q, const roln_real *qd, const roln_real *qdd, roln_real h, uint64_t *s)
{
    static roln_real u[SAMPLES * 2], qbar[6];
    static full_params p;
    static full_optimiser o;
    static full_gradient g;
    static full_start init;
    static full_work work;
    static full_linear_work linwork;
    static const roln_loss ode = ROLN_ODE_WEIGHTS, positions = ROLN_POSITION_WEIGHTS;
    roln_loss acc = ROLN_ACC_WEIGHTS;
    const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    roln_real tau_z[2], tau[6];
    full_jacobian j;
    full_latent z, next;
    full_target target = {.kp = {4, 2}, .kd = {4, 2}};
    full_state x;
    roln_batch b;
    int start[BATCH], k, i;

    acc.force = ROLN_C(0.5);
    for (i = 0; i < 2 * SAMPLES; i++) u[i] = ROLN_C(0.25) * roln_normal(s);
    must(full_init_pod(&p, SAMPLES, q, qd, qbar, s, &init.init_pod), "full: init");
    b.count = BATCH, b.stride = 1, b.start = start, b.q = q, b.qdd = qdd, b.tau = u;
    for (k = 0; k < UPDATES / 8; k++) {
        const int kind = k % 3;
        b.steps = kind > 0 ? H : 0, b.qd = kind < 2 ? qd : NULL;
        for (i = 0; i < BATCH; i++) start[i] = 1 + roln_randint(SAMPLES - H - 2, s);
        memset(&g, 0, sizeof g);
        must(kind == 0 ? full_grad_acc(&p, &acc, &b, &g, &train.full.grad_acc)
                       : full_grad(&p, kind == 1 ? &ode : &positions, &b, h / 4, &g, &train.full.grad),
             "full: grad");
        must(full_update(&p, &opt, &o, &g, &train.full.update), "full: update");
    }
    add(full_theta_size, p.theta);
    add(full_theta_size, o.m), add(full_moment_size, o.v);
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    must(full_encode(&p, &x, &z, &work.encode), "full: encode");
    for (k = 1; k < STEPS / 20; k++) {
        must(full_encode_reference(&p, q + 6 * k, qd + 6 * k, qdd + 6 * k, &target, &work.encode_reference), "full: reference");
        must(full_control(&p, &z, &target, tau_z, &work.control), "full: control");
        must(full_lift(&p, &z, tau_z, tau, &work.lift), "full: lift");
        next = z;
        must(full_linear(&p, &next, u + 2 * k, h / 8, &j, &linwork), "full: linear");
        must(full_step(&p, &z, u + 2 * k, h / 8, &work.step), "full: step");
        add(2, tau_z), add(6, tau), add(16, j.A), add(8, j.B), add(2, z.z), add(2, z.zd), add(2, next.z);
    }
}

/* The encoder of a chart; its decoder from two halves of the data, merged; trained on; its controller. */
static void hash_chart(const roln_real *q, const roln_real *qd, roln_real h, uint64_t *s)
{
    static roln_real qbar[6];
    static curved_params p;
    static curved_optimiser o;
    static curved_gradient g;
    static curved_start init;
    static curved_work work;
    static curved_chart sums, half;
    static curved_refinement turn;
    static const roln_loss ode = ROLN_ODE_WEIGHTS;
    const roln_opt opt = {{ROLN_C(0.001), ROLN_C(0.005), ROLN_C(0.001)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    roln_real tau_z[2], tau[6], left = 0;
    curved_target target = {.kp = {4, 2}, .kd = {4, 2}};
    curved_latent z;
    curved_state x;
    roln_batch b;
    int start[BATCH], k, i;
    must(curved_init_pod(&p, SAMPLES, q, qd, qbar, s, &init.init_pod), "chart: init");
    b.count = SAMPLES / 4, b.steps = 0, b.stride = 1, b.start = NULL, b.q = q, b.qd = qd, b.qdd = NULL, b.tau = NULL;
    for (k = 0; k < 6; k++) {
        must(curved_chart_refine(&p, &b, &turn, &left), "chart: refine");
        add(curved_theta_size, p.theta), add(2, p.zd_max), add(1, &left);
    }
    must(curved_chart_add(&p, SAMPLES / 2, q, &sums, &init.chart_add), "chart: add");
    must(curved_chart_add(&p, SAMPLES / 2, q + SAMPLES / 2 * 6, &half, &init.chart_add), "chart: add");
    curved_chart_merge(&half, &sums);
    must(curved_chart_solve(&p, &sums, ROLN_C(1e-5), &left, &init.chart_solve), "chart: solve");
    add_double((int)(sizeof sums.sums / sizeof *sums.sums), sums.sums);
    add(curved_theta_size, p.theta), add(1, &left);
    b.count = BATCH, b.steps = H, b.start = start;
    for (k = 0; k < UPDATES / 8; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, s);
        memset(&g, 0, sizeof g);
        must(curved_grad(&p, &ode, &b, h, &g, &train.curved.grad), "chart: grad");
        must(curved_update(&p, &opt, &o, &g, &train.curved.update), "chart: update");
    }
    add(curved_theta_size, p.theta);
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    must(curved_encode(&p, &x, &z, &work.encode), "chart: encode");
    for (k = 1; k < STEPS / 20; k++) {
        must(curved_encode_reference(&p, q + 6 * k, qd + 6 * k, q + 6 * k, &target, &work.encode_reference), "chart: reference");
        must(curved_control(&p, &z, &target, tau_z, &work.control), "chart: control");
        must(curved_lift(&p, &z, tau_z, tau, &work.lift), "chart: lift");
        must(curved_step(&p, &z, tau, h / 8, &work.step), "chart: step");
        must(curved_decode(&p, &z, &x, &work.decode), "chart: decode");
        add(6, tau), add(2, z.z), add(2, z.zd), add(6, x.q), add(6, x.qd);
    }
}

/* Maps and distances of random SPD matrices. */
static void hash_spd(uint64_t *s)
{
    enum { n = 5, COUNT = 3 };
    roln_real X[COUNT][n * n], L[n * n], Y[n * n], d = 0;
    union {
        roln_real map[ROLN_SPD_MAP_WORK(n)], dist[ROLN_SPD_DIST_WORK(n)];
    } work;
    int k, i;
    for (k = 0; k < 20; k++) {
        for (i = 0; i < COUNT; i++) {
            int r, c;
            for (r = 0; r < n * n; r++) Y[r] = roln_normal(s);
            for (r = 0; r < n; r++)
                for (c = 0; c < n; c++) X[i][r * n + c] = roln_dot(n, Y + r * n, Y + c * n) + (r == c);
        }
        must(roln_chol(n, X[0], L), "spd: chol");
        must(roln_spd_map(n, ROLN_LOG, 0, L, X[1], Y, work.map), "spd: log"), add(n * n, Y);
        must(roln_spd_map(n, ROLN_POWER, ROLN_C(0.3), L, X[1], Y, work.map), "spd: geodesic"), add(n * n, Y);
        must(roln_spd_dist(n, L, X[2], &d, work.dist), "spd: dist"), add(1, &d);
    }
}

/* Products and exponentials below the smallest normal number: a unit that takes them for 0 shows here. */
static void hash_denormal(uint64_t *s)
{
    enum { n = 24 };
    static roln_real A[n * n], B[n * n], C[n * n];
    const roln_real end = sizeof(roln_real) == 4 ? 100 : 740, root = roln_exp(-end / 2);
    int i;
    for (i = 0; i < n * n; i++) A[i] = root * roln_normal(s), B[i] = root * roln_normal(s);
    roln_mm(n, n, n, A, B, C), add(n * n, C);
    roln_mm_bt(n, n, n, A, B, C), add(n * n, C);
    for (i = 0; i < n; i++) C[i] = roln_dot(n, A + n * i, B), A[i] = roln_uniform(s) - end;
    add(n, C);
    roln_softplus_n(n, A, B, C), add(n, B), add(n, C);
}

/* Sums of 150 products, in order 3 two sums, and a factor and solution of a matrix of rank 48 with damping. */
static void hash_system(uint64_t *s)
{
    enum { n = SIDE, RANK = 48, COLS = 24, K = 150 };
    static roln_real A[K * COLS], S[n * (n + 1)], d[n];
    int i;
    for (i = 0; i < K * COLS; i++) A[i] = roln_normal(s);
    roln_sym_at(K, COLS, 0, COLS, A, S, train.sums), add(COLS * (COLS + 1), S);
    memset(S, 0, sizeof S);
    roln_sym_bt(n, RANK, 0, n, A, S, train.sums);
    for (i = 0; i < n; i++) d[i] = ROLN_C(0.125) + roln_uniform(s);
    must(roln_sym_chol(n, d, S, train.chol), "system: chol");
    roln_sym_solve(n, S, A, d);
    add(n * (n + 1), S), add(n, d);
}

/* Four steps of Gauss-Newton from p; one that is refused is tried again with more damping. */
static pupil_residuals rows;
static pupil_newton newton;
static void learn(pupil_params *p, const roln_newton_opt *opt, const roln_loss *weights, const roln_batch *b, roln_real h)
{
    int k, tries;
    for (k = 0; k < 4; k++, rows.seed += 100) {
        must(pupil_rows(p, weights, b, h, 0, 0, &rows, &train.pupil.rows), "newton: rows");
        must(pupil_newton_rows(p, opt, b->count, &rows, &newton), "newton: tangents");
        pupil_newton_normal_equations(opt, b->count, 0, pupil_newton_side, &rows, &newton, newton.work.sums);
        for (tries = 0; tries < 4; tries++) {
            must(pupil_newton_step(p, opt, b->count, &rows, &newton), "newton: step");
            (void)pupil_rows(&newton.next, weights, b, h, 0, 1, &rows, &train.pupil.rows);
            add(b->count, rows.expect), add(b->count, rows.next);
            if (pupil_newton_accept(p, b->count, b->count, &rows, &newton)) break;
        }
        add(1, &newton.state.lambda), add(1, &newton.state.error);
    }
}

/* 40 rows of accelerations without memory, 16 with, and 4 of windows, whose system is that of the rows; each time what is said to
   be enough to go on gives the same bits. */
static void hash_newton(const roln_real *q, const roln_real *qd, const roln_real *qdd, roln_real h, uint64_t *s)
{
    static roln_real qbar[6], carried[pupil_newton_size], S[pupil_newton_side * (pupil_newton_side + 1)];
    static pupil_params p, was;
    static pupil_start init;
    static const roln_newton fresh = ROLN_NEWTON_START;
    static const roln_loss acc = ROLN_ACC_WEIGHTS, ode = ROLN_ODE_WEIGHTS;
    static const int counts[3] = {40, 16, 4};
    roln_newton_opt opt = ROLN_NEWTON_OPT;
    roln_newton state;
    roln_batch b;
    uint64_t seed;
    int start[40], kind, i;
    must(pupil_init_pod(&p, SAMPLES, q, qd, qbar, s, &init.init_pod), "newton: init");
    newton.state = fresh, rows.seed = 7;
    b.stride = 1, b.start = start, b.q = q, b.qd = qd, b.tau = NULL;
    for (i = 0; i < 40; i++) start[i] = 1 + roln_randint(SAMPLES - 4, s);
    for (kind = 0; kind < 3; kind++) {
        const roln_loss *weights = kind < 2 ? &acc : &ode;
        b.count = counts[kind], b.steps = kind < 2 ? 0 : 2, b.qdd = kind < 2 ? qdd : NULL;
        opt.memory = kind > 0 ? 4 : 1;
        memset(newton.carried, 0, sizeof newton.carried), memset(newton.S, 0, sizeof newton.S);
        learn(&p, &opt, weights, &b, h);
        was = p, state = newton.state, seed = rows.seed;
        memcpy(carried, newton.carried, sizeof carried), memcpy(S, newton.S, sizeof S);
        learn(&p, &opt, weights, &b, h);
        add(pupil_theta_size, p.theta), add(pupil_newton_size, newton.carried);
        memset(&rows, 0, sizeof rows), memset(&newton, 0, sizeof newton);
        newton.state = state, rows.seed = seed;
        memcpy(newton.carried, carried, sizeof carried), memcpy(newton.S, S, sizeof S);
        learn(&was, &opt, weights, &b, h);
        if (memcmp(&p, &was, sizeof p) != 0) must(ROLN_E_CHECKSUM, "newton: resumed");
    }
}

/* Plans of the motor with limits of torque and of rate, and what a tick makes of them. */
static void hash_plan(const wheel_params *p, const roln_limits *of, const wheel_latent *start, roln_real h,
                      wheel_plan_next_work *work)
{
    static const roln_real weight[2] = {1, 1}, ref[2] = {0, ROLN_C(0.5)}, u[1] = {ROLN_C(0.0625)};
    const roln_term term = {ROLN_OF_Q, 0, NULL, weight, ref, 0, 1, NULL, NULL, NULL};
    static wheel_plan plan;
    roln_limits limits = *of;
    wheel_latent z = *start;
    roln_goal goal = {h / 2, 1, &term, u, NULL, NULL, 0, NULL, NULL, NULL, NULL};
    int k;
    limits.tau = ROLN_C(0.5), limits.rate = limits.tau / h, limits.margin = 1000, goal.limits = &limits;
    for (k = 0; k < 5; k++) {
        roln_real torque[1];
        must(wheel_plan_next(p, &goal, &z, &plan, work), "plan");
        must(wheel_plan_follow(p, &goal, &plan, h / 4, &z, torque), "plan: follow");
        add(8, plan.u), add(32, plan.K), add(1, torque), add(1, &plan.plan.cost), add(1, &plan.plan.duality_gap);
        z = plan.s[1];
    }
}

/* The filter and its noise, with samples that are dropped and one joint that jumps. */
static void hash_filter(const wheel_params *p, const roln_real *y, roln_real h, wheel_filter_tick_work *work)
{
    static wheel_filter f;
    roln_noise noise = {.dt = h, .q = ROLN_C(0.015625), .gate = 8, .lost = 3};
    const roln_batch b = {2, 60, 1, NULL, y, NULL, NULL, NULL};
    int k;
    must(wheel_fit_noise(p, &b, &noise, NULL, NULL, &train.wheel.fit_noise), "filter: noise");
    add(1, &noise.tau);
    for (k = 0; k < 200; k++) {
        const roln_real now[2] = {y[2 * k] + (k % 50 == 20), y[2 * k + 1]};
        if (wheel_filter_tick(p, &noise, k % 7 == 3 ? NULL : now, NULL, &f, work) & ROLN_FILTER_NONE) must(ROLN_E_RANGE, "filter");
        add(2, f.s.z), add(2, f.s.zd), add(16, f.F), add(1, &f.f.nis);
    }
}

/* Scratch of the parts with lines of their own. */
typedef union {
    wheel_work work;
    wheel_doubt_ahead_work ahead;
    wheel_plan_next_work plan;
    wheel_plan_tighten_work tighten;
} known_work;

/* Evidence e from the first quarter of a recording. Its deviations and their correlation time are from the second half. Then the
   doubt of states under each law of growth, every third state far outside, and a roll-out with the covariance of its states. */
static void hash_doubt(const wheel_params *p, const roln_real *y, const roln_real *yd, roln_real h, wheel_evidence *e,
                       known_work *w)
{
    static wheel_outlook o;
    int start[40] = {0}, halves, k;
    roln_batch b = {1, SAMPLES / 4 - 1, 1, start, y, yd, NULL, NULL};
    wheel_state x;
    wheel_latent z;
    wheel_doubts d;
    must(wheel_evidence_add(p, &b, e, &train.wheel.evidence_add), "doubt: evidence");
    add(1, &e->count), add(ROLN_TRI(wheel_terms), e->L);
    for (k = 0; k < 40; k++) start[k] = SAMPLES / 2 + 6 * k;
    b.count = 40, b.steps = 2;
    must(wheel_fit_doubt(p, &b, h, e, &train.wheel.fit_doubt), "doubt: deviations");
    add_integer((uint32_t)e->halves), add(4, e->always), add(4, e->grows);
    b.count = 4, b.steps = 16;
    must(wheel_fit_outlook(p, &b, h, e, &train.wheel.fit_outlook), "doubt: time");
    add(1, &e->lasts);
    for (halves = e->halves, k = 0; k < 60; k++) {
        memcpy(x.q, y + 16 * k, sizeof x.q), memcpy(x.qd, yd + 16 * k, sizeof x.qd);
        must(wheel_encode(p, &x, &z, &w->work.encode), "doubt: encode");
        if (k % 3 == 2) z.z[0] *= 2, z.z[1] += 2, z.zd[1] *= 4;
        e->halves = k % (ROLNI_GROWTHS + 2);
        must(wheel_doubt(p, e, &z, &d, &w->work.doubt), "doubt");
        add(1, &d.novelty), add(2, d.zdd), add(2, d.force);
    }
    e->halves = halves;
    for (k = 0; k < 50; k++) {
        must(wheel_doubt_ahead(p, e, &z, y + 2 * k, h / 8, &o, &w->ahead), "doubt: ahead");
        add(2, z.z), add(2, z.zd), add(16, o.P), add(8, o.C);
    }
}

/* Limits from two recordings, whose velocities serve as torques, too. Then NAME_guard_tick and NAME_tick in turn, with blows and
   new states: first with a residual that follows alarms, then with a fixed one. */
static void hash_alarms(const wheel_params *p, const roln_real *y, const roln_real *yd, roln_real h, const wheel_evidence *e,
                        known_work *w)
{
    static wheel_guard guard;
    const int start[2] = {0, SAMPLES / 2};
    const roln_batch b = {2, 99, 1, start, y, yd, NULL, yd};
    roln_limits limits = {.dt = h, .hold = 1, .residual_window = 5, .evidence = e->L, .false_alarms = ROLN_C(0.1)};
    wheel_target r = {.kp = {4, 2}, .kd = {4, 2}};
    wheel_state x;
    wheel_latent z;
    roln_real tau[2], rate[2], limit;
    int k;
    must(wheel_fit_limits(p, &b, ROLN_C(1.25), &limits, tau, rate, &train.wheel.fit_limits), "alarms: limits");
    add(1, &limits.margin), add(1, &limits.residual), add(1, &limits.novelty), add(2, tau), add(2, rate);
    add(1, &limits.q_tolerance), add(1, &limits.qd_tolerance);
    limits.margin = 100, limits.q_tolerance = limits.qd_tolerance = 1;
    must(wheel_encode_reference(p, y, yd, NULL, &r, &w->work.encode_reference), "alarms: reference");
    for (k = 0; k < 2 * SAMPLES; k++) {
        const int at = k % SAMPLES;
        uint32_t faults;
        if (k == SAMPLES) memset(&guard, 0, sizeof guard), limits.false_alarms = 0, limits.residual /= 2;
        memcpy(x.q, y + 2 * at, sizeof x.q), memcpy(x.qd, yd + 2 * at, sizeof x.qd);
        if (at % 128 > 80 && at % 8 < 4) x.qd[0] += ROLN_C(0.25);
        if (at % 100 == 50) x.q[0] *= 8;
        must(wheel_encode(p, &x, &z, &w->work.encode), "alarms: encode");
        faults = k % 2 ? wheel_guard_tick(p, &limits, &x, &z, yd + 2 * at, &guard, &w->work.guard_tick)
                       : wheel_tick(p, &limits, &x, &r, &z, &guard, &w->work.tick);
        add_integer(faults), add(2, guard.tau), add(1, &guard.g.energy), add(1, &guard.g.power), add(1, &guard.g.residual);
        add(1, &guard.g.sum), add(1, &guard.g.raised), add_integer(guard.g.since), add_integer(guard.g.alarms);
        limit = rolni_residual_limit(&limits, &guard.g), add(1, &limit);
        if (faults & ROLN_FAULT_EXPIRED) guard.g.bad = 0, guard.g.faults = 0, guard.g.alarms = 0; /* its limit stays */
    }
}

/* Plans with limits of joints and of a sum of velocities. Each is tightened by what the plan before does not know. */
static void hash_tightened(const wheel_params *p, const wheel_latent *start, roln_real h, const wheel_evidence *e, known_work *w)
{
    static const roln_real weight[2] = {1, 1}, ref[2] = {0, ROLN_C(0.5)}, u[1] = {ROLN_C(0.0625)}, C[2] = {1, ROLN_C(0.5)};
    static const roln_real low[2] = {-1, ROLN_C(-0.25)}, high[2] = {1, ROLN_C(0.25)}, B[2] = {0, 1};
    static roln_real joints[wheel_steps * 2], velocity[wheel_steps], reserve[wheel_steps];
    static wheel_plan plan;
    const roln_motors motor = {1, B, ROLN_C(0.125)};
    const roln_limits limits = {.dt = h / 4, .margin = 1000, .tau = ROLN_C(0.5), .rate = ROLN_C(0.5) / h, .motors = &motor};
    const roln_term term[3] = {{.of = ROLN_OF_Q, .weight = weight, .ref = ref, .last = 1},
                               {.of = ROLN_OF_Q, .weight = weight, .low = low, .high = high, .tighten = joints},
                               {.of = ROLN_OF_ZD, .count = 1, .C = C, .weight = weight, .low = low, .tighten = velocity}};
    const roln_goal goal = {.dt = h / 2, .terms = 3, .term = term, .u = u, .limits = &limits, .reserve = reserve};
    wheel_latent z = *start;
    int k, i;
    for (k = 0; k < 5; k++) {
        roln_real torque[1];
        must(wheel_plan_next(p, &goal, &z, &plan, &w->plan), "tightened: plan");
        must(wheel_plan_follow(p, &goal, &plan, h / 4, &z, torque), "tightened: follow");
        add(8, plan.u), add(32, plan.K), add(1, torque), add(1, &plan.plan.cost), add(1, &plan.plan.duality_gap);
        must(wheel_plan_tighten(p, e, &goal, &plan, term + 1, 2, joints, &w->tighten), "tightened: joints");
        must(wheel_plan_tighten(p, e, &goal, &plan, term + 2, 2, velocity, &w->tighten), "tightened: velocity");
        must(wheel_plan_tighten(p, e, &goal, &plan, NULL, 2, reserve, &w->tighten), "tightened: reserve");
        add(2 * wheel_steps, joints), add(wheel_steps, velocity), add(wheel_steps, reserve);
        for (i = 0; i < wheel_steps; i++) reserve[i] = ROLN_MIN(reserve[i], limits.tau / 2);
        z = plan.s[1];
    }
}

/* The parts with lines of their own. z: where plans start. */
static void hash_known(const wheel_params *p, const roln_real *y, const roln_real *yd, const wheel_latent *z, roln_real h,
                       known_work *w)
{
    static wheel_evidence e;
    line = DOUBT, hash_doubt(p, y, yd, h, &e, w);
    line = ALARMS, hash_alarms(p, y, yd, h, &e, w);
    line = TIGHTENED, hash_tightened(p, z, h, &e, w);
    line = FIRST;
}

/* Two of the joints, the second one turning round. */
static void hash_wheel(const roln_real *q, const roln_real *qd, roln_real h, uint64_t *s)
{
    static roln_real y[SAMPLES * 2], yd[SAMPLES * 2], K[4], P[16];
    static wheel_params p;
    static wheel_optimiser o;
    static wheel_gradient g;
    static wheel_start init;
    static union {
        wheel_work work;
        wheel_lqr_work lqr;
        wheel_filter_tick_work filter;
        wheel_plan_next_work plan;
        known_work known;
    } scratch;
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    const roln_real B[2] = {0, 1}, ones[2] = {1, 1}, none[1] = {0};
    const roln_motors motor = {1, B, ROLN_C(0.125)};
    const roln_cost cost = {ones, ones, ones, h / 4, &motor};
    const roln_limits limits = {.dt = h / 4, .margin = 100, .tau = 100, .motors = &motor};
    roln_batch b = {BATCH, H, 1, NULL, y, yd, NULL, NULL};
    wheel_state x;
    wheel_latent z;
    wheel_target r;
    wheel_guard guard;
    roln_real qbar[2];
    int start[BATCH], k, i;
    for (k = 0; k < SAMPLES; k++) {
        y[2 * k] = q[6 * k], yd[2 * k] = qd[6 * k];
        y[2 * k + 1] = 8 * q[6 * k + 1], yd[2 * k + 1] = 8 * qd[6 * k + 1];
    }
    must(wheel_init_pod(&p, SAMPLES, y, yd, qbar, s, &init.init_pod), "wheel: init");
    b.start = start;
    for (k = 0; k < 20; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, s);
        memset(&g, 0, sizeof g);
        must(wheel_grad(&p, &weights, &b, h, &g, &train.wheel.grad), "wheel: grad");
        must(wheel_update(&p, &opt, &o, &g, &train.wheel.update), "wheel: update");
    }
    must(wheel_fit_range(&p, SAMPLES, y, yd, &train.wheel.fit_range), "wheel: range");
    add(2, qbar), add(wheel_theta_size, p.theta), add(2, p.zd_max);
    memcpy(x.q, y, sizeof x.q), memcpy(x.qd, yd, sizeof x.qd);
    must(wheel_encode(&p, &x, &z, &scratch.work.encode), "wheel: encode");
    must(wheel_encode_reference(&p, x.q, x.qd, NULL, &r, &scratch.work.encode_reference), "wheel: reference");
    must(wheel_gains(&p, &z, ones, ones, &r, &scratch.work.gains), "wheel: gains");
    memset(&guard, 0, sizeof guard);
    for (k = 0; k < 200; k++) {
        (void)wheel_tick(&p, &limits, &x, &r, &z, &guard, &scratch.work.tick);
        must(wheel_step(&p, &z, y + 2 * k, h / 4, &scratch.work.step), "wheel: step");
        must(wheel_decode(&p, &z, &x, &scratch.work.decode), "wheel: decode");
        add(2, x.q), add(2, x.qd), add(1, guard.tau), add(1, &guard.g.allocation_residual);
    }
    must(wheel_lqr(&p, &cost, &z, none, K, P, &scratch.lqr), "wheel: lqr");
    add(4, K), add(16, P);
    hash_filter(&p, y, h, &scratch.filter);
    hash_plan(&p, &limits, &z, h, &scratch.plan);
    hash_known(&p, y, yd, &z, h, &scratch.known);
}

/* Two of the joints again, with polynomials. */
static void hash_crane(const roln_real *q, const roln_real *qd, roln_real h, uint64_t *s)
{
    static roln_real y[SAMPLES * 2], yd[SAMPLES * 2];
    static crane_params p;
    static crane_optimiser o;
    static crane_gradient g;
    static crane_start init;
    static union {
        crane_work work;
        crane_linear_work linear;
    } scratch;
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    const roln_opt opt = {{0, ROLN_C(0.005), 0}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 5};
    roln_batch b = {BATCH, H, 1, NULL, y, yd, NULL, NULL};
    crane_state x;
    crane_latent z, next;
    crane_jacobian j;
    roln_real qbar[2];
    int start[BATCH], k, i;
    for (k = 0; k < SAMPLES; k++)
        for (i = 0; i < 2; i++) y[2 * k + i] = q[6 * k + i], yd[2 * k + i] = qd[6 * k + i];
    must(crane_init_pod(&p, SAMPLES, y, yd, qbar, s, &init.init_pod), "crane: init");
    b.start = start;
    for (k = 0; k < 20; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, s);
        memset(&g, 0, sizeof g);
        must(crane_grad(&p, &weights, &b, h / 8, &g, &train.crane.grad), "crane: grad");
        must(crane_update(&p, &opt, &o, &g, &train.crane.update), "crane: update");
    }
    add(crane_theta_size, p.theta);
    memcpy(x.q, y, sizeof x.q), memcpy(x.qd, yd, sizeof x.qd);
    must(crane_encode(&p, &x, &z, &scratch.work.encode), "crane: encode");
    for (k = 0; k < 100; k++) {
        next = z;
        must(crane_linear(&p, &next, y + 2 * k, h / 8, &j, &scratch.linear), "crane: linear");
        must(crane_step(&p, &z, y + 2 * k, h / 8, &scratch.work.step), "crane: step");
        add(2, z.z), add(2, z.zd), add(2, next.z), add(16, j.A), add(8, j.B);
    }
}

static void put_hashes(void)
{
    static const char *const part[LINES] = {"", "doubt ", "alarms ", "tightened "};
    int k;
    put_text("\n");
    for (k = 0; k < LINES; k++) {
        put_text(sizeof(roln_real) == 4 ? "float " : "double "), put_text(part[k]);
        put_hex(hash[k], 16);
        put_text("\n");
    }
}

int main(void)
{
    static roln_real q[SAMPLES * 6], qd[SAMPLES * 6], qdd[SAMPLES * 6], qbar[6];
    static net_params p;
    static net_optimiser o;
    static net_gradient g;
    static net_start init;
    static net_work work;
    static unsigned char packed[net_packed_size];
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), ROLN_C(2e-5), 5};
    const roln_real h = ROLN_C(0.0625);
    roln_batch b;
    net_state x;
    net_latent z;
    uint64_t s = 2026;
    int start[BATCH], k, i;

    record(&s, h, q, qd);
    for (i = 6; i < 6 * (SAMPLES - 1); i++) qdd[i] = (qd[i + 6] - qd[i - 6]) / (2 * h);
    must(net_init_pod(&p, SAMPLES, q, qd, qbar, &s, &init.init_pod), "init");
    b.count = BATCH, b.steps = H, b.stride = 1, b.start = start, b.q = q, b.qd = qd, b.qdd = NULL, b.tau = NULL;
    for (k = 0; k < UPDATES; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, &s);
        memset(&g, 0, sizeof g);
        must(net_grad(&p, &weights, &b, h, &g, &train.net.grad), "grad");
        must(net_update(&p, &opt, &o, &g, &train.net.update), "update");
    }
    net_pack(&p, packed);
    for (i = 0; i < net_packed_size; i++) board_put(packed[i]);
    for (i = 0; i < net_packed_size; i++) packed[i] = board_get();
    memset(&p, 0, sizeof p);
    must(net_unpack(net_packed_size, packed, &p), "unpack");
    add(2, &p.scale.q);
    add(net_theta_size, p.theta);
    add(2, &o.adam.unbias1);
    add(net_theta_size, o.m), add(net_moment_size, o.v), add(net_moment_size, o.v_max);

    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    must(net_encode(&p, &x, &z, &work.encode), "encode");
    for (k = 0; k < STEPS; k++) {
        must(net_step(&p, &z, k < 100 ? q + 6 * k : NULL, h / 4, &work.step), "step"); /* the data serve as a force, too */
        must(net_decode(&p, &z, &x, &work.decode), "decode");
        add(2, z.z), add(2, z.zd), add(6, x.q), add(6, x.qd);
    }
    hash_full(q, qd, qdd, h, &s);
    hash_chart(q, qd, h, &s);
    hash_spd(&s);
    hash_denormal(&s);
    hash_system(&s);
    hash_newton(q, qd, qdd, h, &s);
    hash_wheel(q, qd, h, &s);
    hash_crane(q, qd, h, &s);
    put_hashes();
    return 0;
}
