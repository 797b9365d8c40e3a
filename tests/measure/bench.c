/* SPDX-License-Identifier: MIT */
/* bench.c - what roln costs on this machine, one thread, float: minimum and median of many runs, against MuJoCo's own
   routines (double there) measured in the same run, and against fixed targets. Times are CPU times, so that a busy
   machine disturbs them little. bench NAME runs only the rows whose name contains NAME. */
#define ROLN_NAME cloth
#define ROLN_AE 600, 128, 64, 32, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME arm /* of the sizes of examples/pend16.h, with every option of the mechanics */
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 32, 32
#define ROLN_DAMPING 1
#include "roln.h"

#define ROLN_NAME plain
#define ROLN_AE 10
#define ROLN_MLP 64, 64
#include "roln.h"

#define ROLN_NAME delan
#define ROLN_AE 10
#define ROLN_MLP 64, 64
#define ROLN_MASS cholesky
#include "roln.h"

#define ROLN_NAME gyro
#define ROLN_AE 10
#define ROLN_MLP 64, 64
#define ROLN_LAYERS gyro
#include "roln.h"

/* models that learn */
#define ROLN_NAME fall
#define ROLN_AE 600, 128, 64, 32, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME small
#define ROLN_AE 16, 8, 4
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME small_rk4
#define ROLN_AE 16, 8, 4
#define ROLN_MLP 64, 64
#include "roln.h"

#define ROLN_NAME n64
#define ROLN_AE 64, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n128
#define ROLN_AE 128, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n256
#define ROLN_AE 256, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n512
#define ROLN_AE 512, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n1024
#define ROLN_AE 1024, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n2048
#define ROLN_AE 2048, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#define ROLN_NAME n4096
#define ROLN_AE 4096, 64, 10
#define ROLN_MLP 64, 64
#define ROLN_INTEGRATOR euler
#include "roln.h"

#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { MATRICES = 64, MAX_N = 16, LENGTH = 1024, HORIZON = 8, SAMPLES = 4000 };

/* One line of the table. */
typedef struct row row;
struct row {
    const char *name;
    void (*setup)(const row *), (*run)(const row *); /* run: what is timed */
    int size[6], more;                               /* sizes; more: kind of matrix, windows of a batch */
    int count;                                       /* results of one run: matrices, elements */
    double target;                                   /* seconds; 0: none */
    const char *peer;                                /* a peer on the same input, and its name */
    void (*run_peer)(const row *);
    double eigen;                                    /* nanoseconds of Eigen, on another machine */
};

static uint64_t seed = 1;

static void fail(const char *what, int status)
{
    fprintf(stderr, "bench: %s: %d\n", what, status);
    exit(1);
}

static void must(roln_status st)
{
    if (st != ROLN_OK) fail("status", st);
}

static roln_real *reals(int n)
{
    roln_real *x = calloc((size_t)n, sizeof *x);
    if (x == NULL) fail("out of memory, numbers", n);
    return x;
}

static void fill(int n, roln_real sd, roln_real *x)
{
    while (n-- > 0)
        *x++ = sd * roln_normal(&seed);
}

/* ---- small matrices --------------------------------------------------------------------------- */

static struct {
    roln_real A[MATRICES][MAX_N * MAX_N], x[MAX_N], y[MAX_N], X[MAX_N * MAX_N];
    union {
        roln_real eig[ROLN_EIG_WORK(MAX_N)], map[ROLN_SPD_MAP_WORK(MAX_N)], scaled[MAX_N * MAX_N];
    } work;
    mjtNum dA[MATRICES][MAX_N * MAX_N], dx[MAX_N], dy[MAX_N], dX[MAX_N * MAX_N], quat[4];
} small;

enum { RANDOM, HARD, POSITIVE }; /* kinds of matrices */

/* Eigenvalue i of n of the hard matrix number k: two clusters, one repeated, graded over 20 decades, rank one. */
static roln_real hard_eigenvalue(int k, int n, int i)
{
    switch (k % 4) {
    case 0: return (roln_real)(i % 2) + ROLN_C(1e-6) * roln_uniform(&seed);
    case 1: return i == 0 ? 2 : 1;
    case 2: return roln_exp(-46 * (roln_real)i / (roln_real)(n - 1));
    default: return i == 0;
    }
}

static void small_setup(const row *r)
{
    const int n = r->size[0];
    int k, i, j;
    for (k = 0; k < MATRICES; k++) {
        roln_real *A = small.A[k], *Q = small.X, *l = small.x;
        for (i = 0; i < n; i++)
            for (j = 0; j <= i; j++)
                A[i * n + j] = A[j * n + i] = roln_normal(&seed);
        if (r->more != RANDOM) { /* random directions, given eigenvalues */
            must(roln_eig(n, A, l, Q, small.work.eig));
            memset(A, 0, sizeof small.A[k]);
            for (i = 0; i < n; i++) {
                l[i] = r->more == HARD ? hard_eigenvalue(k, n, i) : 1 + roln_uniform(&seed);
                for (j = 0; j < n; j++)
                    small.work.scaled[i * n + j] = l[i] * Q[i * n + j];
            }
            roln_mm_at(n, n, n, Q, small.work.scaled, A);
            for (i = 0; i < n; i++)
                for (j = 0; j < i; j++)
                    A[j * n + i] = A[i * n + j];
        }
        for (i = 0; i < n * n; i++)
            small.dA[k][i] = (mjtNum)A[i];
    }
    fill(n, 1, small.y);
    for (i = 0; i < n; i++)
        small.dy[i] = (mjtNum)small.y[i];
}

static void eig(const row *r)
{
    int k;
    for (k = 0; k < MATRICES; k++)
        must(roln_eig(r->size[0], small.A[k], small.x, small.X, small.work.eig));
}

static void eig3_mujoco(const row *r)
{
    int k;
    (void)r;
    for (k = 0; k < MATRICES; k++)
        mju_eig3(small.dx, small.dX, small.quat, small.dA[k]);
}

static void chol(const row *r)
{
    const int n = r->size[0];
    int k;
    for (k = 0; k < MATRICES; k++) {
        must(roln_chol(n, small.A[k], small.X));
        roln_solve_lower(n, small.X, small.y, small.x);
        roln_solve_lower_t(n, small.X, small.x, small.x);
    }
}

static void chol_mujoco(const row *r)
{
    const int n = r->size[0];
    int k;
    for (k = 0; k < MATRICES; k++) {
        memcpy(small.dX, small.dA[k], (size_t)(n * n) * sizeof *small.dX);
        mju_cholFactor(small.dX, n, 0);
        mju_cholSolve(small.dx, small.dX, small.dy, n);
    }
}

static void spd_exp(const row *r)
{
    int k;
    for (k = 0; k < MATRICES; k++)
        must(roln_spd_map(r->size[0], ROLN_EXP, 0, NULL, small.A[k], small.X, small.work.map));
}

/* SPD matrices with condition below 2 as seen from the first; size: n, what is timed. */
enum { LOG_MAP, ROOT, LOG_DD1, MAP_BWD, DIST };
static struct {
    roln_real A[MAX_N * MAX_N], X[(MATRICES + 4) * MAX_N * MAX_N], l[MAX_N], f[MAX_N], K[MAX_N * MAX_N], V[MAX_N * MAX_N];
    roln_real W[MAX_N * MAX_N], Y[MAX_N * MAX_N], g[2][MAX_N * MAX_N], d;
    union {
        roln_real frame[ROLN_SPD_FRAME_WORK(MAX_N)], map[ROLN_SPD_MAP_WORK(MAX_N)], map_bwd[ROLN_SPD_MAP_BWD_WORK(MAX_N)];
        roln_real dist[ROLN_SPD_DIST_WORK(MAX_N)];
    } work;
} spd;

static void spd_setup(const row *r)
{
    const int n = r->size[0];
    int k;
    small_setup(r);
    for (k = 0; k < MATRICES + 4; k++)
        memcpy(spd.X + k * n * n, small.A[k % MATRICES], (size_t)(n * n) * sizeof *spd.X);
    must(roln_chol(n, spd.X, spd.A));
    must(roln_spd_frame(n, spd.A, spd.X + n * n, spd.l, spd.V, spd.W, spd.work.frame));
    must(roln_map_values(n, ROLN_LOG, 0, spd.l, spd.f));
    roln_map_dd1(n, ROLN_LOG, 0, spd.l, spd.f, spd.K);
}

static void spd_run(const row *r)
{
    const int n = r->size[0];
    int k;
    for (k = 0; k < MATRICES; k++) {
        const roln_real *X = spd.X + k * n * n;
        switch (r->size[1]) {
        case LOG_MAP: must(roln_spd_map(n, ROLN_LOG, 0, spd.A, X, spd.Y, spd.work.map)); break;
        case ROOT: must(roln_spd_map(n, ROLN_POWER, ROLN_C(0.5), NULL, X, spd.Y, spd.work.map)); break;
        case LOG_DD1: roln_map_dd1(n, ROLN_LOG, 0, spd.l, spd.f, spd.K); break;
        case MAP_BWD: roln_spd_map_bwd(n, spd.l, spd.f, spd.K, spd.V, spd.W, X, spd.g[0], spd.g[1], spd.work.map_bwd); break;
        default: must(roln_spd_dist(n, spd.A, X, &spd.d, spd.work.dist)); break;
        }
    }
}

/* ---- manifolds -------------------------------------------------------------------------------- */

static struct {
    roln_block block;
    roln_adam adam;
    roln_real x[200], g[200], m[200], v, v_max, work[1000];
} point;

/* size: k, m */
static void stiefel_setup(const row *r)
{
    const roln_block b = {&roln_stiefel, r->size[0], r->size[1], 0};
    memset(&point, 0, sizeof point);
    point.block = b;
    must(roln_stiefel_init(b.rows, b.cols, point.x, &seed, point.work));
    fill(b.rows * b.cols, 1, point.g);
}

static void stiefel_update(const row *r)
{
    static const roln_opt opt = ROLN_OPT(ROLN_C(1e-2), 0);
    (void)r;
    const roln_moments moments = {point.m, &point.v, &point.v_max};
    must(roln_adam_update(1, &point.block, &opt, 1, point.g, point.x, &point.adam, &moments, point.work));
}

/* ---- vectors ---------------------------------------------------------------------------------- */

static struct {
    roln_real A[600 * 128], x[LENGTH], y[LENGTH], s[LENGTH];
    mjtNum dA[600 * 128], dx[LENGTH], dy[LENGTH];
} big;

static void big_setup(const row *r)
{
    int i;
    (void)r;
    fill(600 * 128, 1, big.A);
    fill(LENGTH, 1, big.x);
    for (i = 0; i < 600 * 128; i++)
        big.dA[i] = (mjtNum)big.A[i];
    for (i = 0; i < LENGTH; i++)
        big.dx[i] = (mjtNum)big.x[i];
}

static void matvec_order1(const row *r)
{
    roln_mm(1, r->size[1], r->size[0], big.x, big.A, big.y);
}

static void matvec_order2(const row *r)
{
    roln_mm_bt(1, r->size[1], r->size[0], big.x, big.A, big.y);
}

static void matvec_mujoco(const row *r)
{
    mju_mulMatVec(big.dy, big.dA, big.dx, r->size[0], r->size[1]);
}

static void softplus(const row *r)
{
    (void)r;
    roln_softplus_n(LENGTH, big.x, big.y, big.s);
}

/* ---- large symmetric systems ------------------------------------------------------------------- */

/* size: k, n of roln_sym_at and roln_sym_bt; 0, n of a system that is solved. */
static struct {
    roln_real *A, *S, *d, *x, *work;
} sym;

static void sym_setup(const row *r)
{
    const int k = r->size[0], n = r->size[1];
    const size_t next = (size_t)n + 1;
    int i;
    free(sym.A), free(sym.S), free(sym.d), free(sym.x), free(sym.work);
    sym.A = reals(k * n + 1), sym.S = reals(n * (n + 1)), sym.d = reals(n), sym.x = reals(n);
    sym.work = reals(ROLN_MAX(ROLN_SYM_WORK, ROLN_SYM_CHOL_WORK(n)));
    fill(k * n, 1, sym.A);
    fill(k > 0 ? 0 : n * (n + 1), 1 / (roln_real)n, sym.S);
    for (i = 0; i < n; i++)
        sym.S[(size_t)i * next + (size_t)i] = sym.d[i] = sym.x[i] = 1;
    if (k == 0) must(roln_sym_chol(n, sym.d, sym.S, sym.work));
}

static void sym_at(const row *r)
{
    roln_sym_at(r->size[0], r->size[1], 0, r->size[1], sym.A, sym.S, sym.work);
}

static void sym_bt(const row *r)
{
    roln_sym_bt(r->size[1], r->size[0], 0, r->size[1], sym.A, sym.S, sym.work);
}

static void sym_chol(const row *r)
{
    must(roln_sym_chol(r->size[1], sym.d, sym.S, sym.work));
}

static void sym_solve(const row *r)
{
    roln_sym_solve(r->size[1], sym.S, sym.d, sym.x);
}

/* As many multiplications, each followed by an addition, as the row takes, of numbers that stay in registers: the roof without
   contraction. Twelve chains of the vectors that the kernels use. */
static void sym_roof(const row *r)
{
    const double k = r->size[0], n = r->size[1], count = k > 0 ? k * n * (n + 1) / 2 : n * n * n / 6;
    static volatile roln_real half = ROLN_C(0.5);
    static volatile rolni_w out;
    const rolni_w zero = {0}, a = zero + half, b = a + half;
    long left = (long)(count / (12 * ROLNI_LANES));
#define CHAINS(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11)
#define CHAIN(i) rolni_w c##i = b + i;
    CHAINS(CHAIN)
#undef CHAIN
    for (; left > 0; left--) {
#define CHAIN(i) c##i = c##i * a + b;
        CHAINS(CHAIN)
#undef CHAIN
    }
#define CHAIN(i) + c##i
    out = zero CHAINS(CHAIN);
#undef CHAIN
    (void)out;
}

/* ---- the control tick, through the typed shell ------------------------------------------------ */

static struct {
    cloth_params p;
    cloth_state x, out;
    cloth_latent z, next;
    roln_real tau[cloth_N], tau_z[cloth_n];
    cloth_work work;
    cloth_start start;
} tick;

static void tick_setup(const row *r)
{
    (void)r;
    must(cloth_init(&tick.p, &seed, &tick.start.init));
    fill(cloth_N, ROLN_C(0.3), tick.x.q);
    fill(cloth_N, ROLN_C(0.3), tick.x.qd);
    fill(cloth_N, ROLN_C(0.3), tick.tau);
    must(cloth_encode(&tick.p, &tick.x, &tick.z, &tick.work.encode));
}

static void tick_encode(const row *r)
{
    (void)r;
    must(cloth_encode(&tick.p, &tick.x, &tick.next, &tick.work.encode));
}

static void tick_step(const row *r)
{
    (void)r;
    tick.next = tick.z;
    must(cloth_step(&tick.p, &tick.next, NULL, ROLN_C(1e-3), &tick.work.step));
}

static void tick_decode(const row *r)
{
    (void)r;
    must(cloth_decode(&tick.p, &tick.z, &tick.out, &tick.work.decode));
}

static void tick_reduce(const row *r)
{
    (void)r;
    must(cloth_reduce(&tick.p, &tick.z, tick.tau, tick.tau_z, &tick.work.reduce));
}

static void tick_all(const row *r)
{
    tick_encode(r);
    must(cloth_step(&tick.p, &tick.next, NULL, ROLN_C(1e-3), &tick.work.step));
    must(cloth_decode(&tick.p, &tick.next, &tick.out, &tick.work.decode));
}

/* ---- models that learn ------------------------------------------------------------------------- */

/* Of a model three functions for rows, whose r->more is windows of a batch: NAME_predict is encode, a step, decode; NAME_learn the
   gradient of a batch and an update so small that every run does the same work. */
#define NET(NAME) \
    static struct { \
        NAME##_params p; \
        NAME##_gradient g; \
        NAME##_optimiser o; \
        union { NAME##_start start; NAME##_work work; NAME##_train train; } room; \
        NAME##_state x, out; \
        roln_real *data; /* q, then qd, of the windows of a batch */ \
    } NAME##_net; \
    static void NAME##_begin(const row *r) \
    { \
        const int count = 2 * r->more * (HORIZON + 1) * NAME##_N; \
        memset(&NAME##_net.o, 0, sizeof NAME##_net.o); \
        must(NAME##_init(&NAME##_net.p, &seed, &NAME##_net.room.start.init)); \
        free(NAME##_net.data), NAME##_net.data = reals(count); \
        fill(count, ROLN_C(0.3), NAME##_net.data); \
        memcpy(&NAME##_net.x, NAME##_net.data, sizeof NAME##_net.x); \
    } \
    ROLN_FN void NAME##_predict(const row *r) \
    { \
        NAME##_latent s; \
        (void)r; \
        must(NAME##_encode(&NAME##_net.p, &NAME##_net.x, &s, &NAME##_net.room.work.encode)); \
        must(NAME##_step(&NAME##_net.p, &s, NULL, ROLN_C(1e-3), &NAME##_net.room.work.step)); \
        must(NAME##_decode(&NAME##_net.p, &s, &NAME##_net.out, &NAME##_net.room.work.decode)); \
    } \
    static void NAME##_learn(const row *r) \
    { \
        static const roln_loss weights = ROLN_ODE_WEIGHTS; \
        static const roln_opt opt = { \
            .lr = {ROLN_C(1e-9), ROLN_C(1e-9), ROLN_C(1e-9)}, .beta1 = ROLN_C(0.9), .beta2 = ROLN_C(0.999), .eps = ROLN_C(1e-8), \
            .decay = ROLN_C(2e-5), .clip = 5}; \
        const roln_batch b = {.count = r->more, .steps = HORIZON, .stride = 1, .q = NAME##_net.data, \
                              .qd = NAME##_net.data + r->more * (HORIZON + 1) * NAME##_N}; \
        memset(&NAME##_net.g, 0, sizeof NAME##_net.g); \
        must(NAME##_grad(&NAME##_net.p, &weights, &b, ROLN_C(1e-3), &NAME##_net.g, &NAME##_net.room.train.grad)); \
        must(NAME##_update(&NAME##_net.p, &opt, &NAME##_net.o, &NAME##_net.g, &NAME##_net.room.train.update)); \
    }
NET(fall)
NET(small)
NET(small_rk4)
NET(n64)
NET(n128)
NET(n256)
NET(n512)
NET(n1024)
NET(n2048)
NET(n4096)

static const struct {
    int N;
    void (*begin)(const row *), (*predict)(const row *), (*learn)(const row *);
} sizes[] = {
    {64, n64_begin, n64_predict, n64_learn},
    {128, n128_begin, n128_predict, n128_learn},
    {256, n256_begin, n256_predict, n256_learn},
    {512, n512_begin, n512_predict, n512_learn},
    {1024, n1024_begin, n1024_predict, n1024_learn},
    {2048, n2048_begin, n2048_predict, n2048_learn},
    {4096, n4096_begin, n4096_predict, n4096_learn},
};

/* ---- mechanics and control, 16 joints, n = 4 --------------------------------------------------- */

static struct {
    arm_params p;
    arm_start start;
    arm_work work;
    arm_linear_work linwork;
    arm_guard guard;
    arm_state x;
    arm_latent s;
    arm_target aim;
    arm_jacobian linear;
    roln_real tau[arm_N], tau_z[arm_n], one[arm_n], zero[arm_N];
} tick4;

static void arm_setup(const row *r)
{
    (void)r;
    memset(&tick4, 0, sizeof tick4);
    must(arm_init(&tick4.p, &seed, &tick4.start.init));
    fill(arm_N, ROLN_C(0.2), tick4.x.q), fill(arm_N, ROLN_C(0.2), tick4.x.qd);
    for (int i = 0; i < arm_n; i++)
        tick4.one[i] = tick4.aim.kp[i] = tick4.aim.kd[i] = 1, tick4.p.z_min[i] = -9, tick4.p.z_max[i] = 9, tick4.p.zd_max[i] = 9;
    must(arm_encode(&tick4.p, &tick4.x, &tick4.s, &tick4.work.encode));
}

static void arm_inverse_run(const row *r)
{
    (void)r;
    must(arm_inverse(&tick4.p, &tick4.s, r->more ? tick4.one : NULL, tick4.one, tick4.tau_z, &tick4.work.inverse));
}

static void arm_inertia_run(const row *r)
{
    (void)r;
    must(arm_inertia(&tick4.p, &tick4.s, tick4.x.qd, tick4.tau, &tick4.work.inertia));
}

static void arm_linear_run(const row *r)
{
    arm_latent s = tick4.s;
    (void)r;
    must(arm_linear(&tick4.p, &s, NULL, ROLN_C(1e-3), &tick4.linear, &tick4.linwork));
}

/* encode_reference, then encode, control, lift, guard. */
static void arm_control_run(const row *r)
{
    static const roln_limits limits = {
        .dt = ROLN_C(1e-3), .margin = 1, .residual = 1000, .tau = 1000, .hold = 5, .q_tolerance = 1000, .qd_tolerance = 1000};
    (void)r;
    must(arm_encode_reference(&tick4.p, tick4.zero, tick4.zero, tick4.zero, &tick4.aim, &tick4.work.encode_reference));
    if (arm_tick(&tick4.p, &limits, &tick4.x, &tick4.aim, &tick4.s, &tick4.guard, &tick4.work.tick) != 0)
        fail("fault", (int)tick4.guard.g.faults);
}

/* ---- forward dynamics, with three mass matrices ------------------------------------------------ */

#define HEAD(NAME) \
    static struct { \
        NAME##_params p; \
        NAME##_start start; \
        roln_real s[2 * NAME##_n], tape[ROLN_LNN_TAPE(NAME##_SIZE, 1, 0, 1)], work[ROLN_LNN_ZDD_WORK(NAME##_SIZE, 0, 1)]; \
    } NAME##_head; \
    static void NAME##_setup(const row *r) \
    { \
        (void)r; \
        must(NAME##_init(&NAME##_head.p, &seed, &NAME##_head.start.init)); \
        fill(2 * NAME##_n, ROLN_C(0.3), NAME##_head.s); \
    } \
    static void NAME##_zdd(const row *r) \
    { \
        roln_real zdd[NAME##_n]; \
        (void)r; \
        must(roln_lnn_zdd(&NAME##_model.lnn, 0, 1, NAME##_head.p.theta, NAME##_head.s, NULL, zdd, NAME##_head.tape, \
                          NAME##_head.work)); \
    }
#define plain_SIZE(x) plain_##x
#define delan_SIZE(x) delan_##x
#define gyro_SIZE(x) gyro_##x
HEAD(plain)
HEAD(delan)
HEAD(gyro)

/* ---- measuring -------------------------------------------------------------------------------- */

static double now(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

typedef struct {
    double min, median; /* seconds */
} timing;

/* Runs for about a second, at least 7 times: samples of 50 us or more, the first are warm-up. A peer runs between the samples, so
   that both meet the same moments of the machine. */
static void measure(const row *r, int runs, void (*const run[])(const row *), timing *result)
{
    static double sample[2][SAMPLES];
    int reps[2] = {1, 1}, n, i, k;
    double begin, start, t = 0;
    for (k = 0; k < runs; k++)
        for (begin = now(); start = now(), i = 0, 1;) {
            for (; i < reps[k]; i++)
                run[k](r);
            if ((t = now() - start) > 5e-5 && now() - begin > 0.05) break;
            if (t <= 5e-5) reps[k] *= 2;
        }
    for (begin = now(), n = 0; n < SAMPLES && (n < 7 || now() - begin < runs); n++)
        for (k = 0; k < runs; k++) {
            start = now();
            for (i = 0; i < reps[k]; i++)
                run[k](r);
            sample[k][n] = (now() - start) / reps[k];
        }
    for (k = 0; k < runs; k++) {
        qsort(sample[k], (size_t)n, sizeof **sample, ascending);
        result[k].min = sample[k][0];
        result[k].median = sample[k][n / 2];
    }
}

static void print_time(double s)
{
    if (s < 1e-6) printf(" %8.4g ns", 1e9 * s);
    else if (s < 1e-3) printf(" %8.4g us", 1e6 * s);
    else printf(" %8.4g ms", 1e3 * s);
}

static void print_row(const row *r)
{
    const double count = r->count;
    void (*const run[])(const row *) = {r->run, r->run_peer};
    timing t[2];
    seed = 1;
    r->setup(r);
    measure(r, r->run_peer ? 2 : 1, run, t);
    printf("%-36s", r->name);
    print_time(t[0].min / count);
    print_time(t[0].median / count);
    if (r->run_peer) {
        printf("  %s", r->peer);
        print_time(t[1].min / count);
        printf(", ratio %.2f", t[1].min / t[0].min);
    }
    if (r->eigen > 0) printf("  Eigen, other machine %5.0f ns", r->eigen);
    if (r->target > 0) {
        printf("  target");
        print_time(r->target);
        printf(t[0].min <= r->target ? ", met" : ", missed");
    }
    printf("\n");
    fflush(stdout);
}

#define EIG(n, ns) \
    {"eigen n = " #n, small_setup, eig, {n}, RANDOM, MATRICES, 0, NULL, NULL, ns}, \
    {"eigen n = " #n ", hard", small_setup, eig, {n}, HARD, MATRICES, 0, NULL, NULL, 0}
#define SPD_ROW(name, n, what) {name " n = " #n, spd_setup, spd_run, {n, what}, POSITIVE, MATRICES, 0, NULL, NULL, 0}
#define SPD(n) \
    SPD_ROW("SPD log at a base point", n, LOG_MAP), SPD_ROW("SPD square root", n, ROOT), \
    SPD_ROW("SPD log, divided differences", n, LOG_DD1), SPD_ROW("SPD map, backward", n, MAP_BWD), \
    SPD_ROW("SPD distance", n, DIST)
#define MATVEC(m, k) \
    {"mat-vec " #m "x" #k ", order 1", big_setup, matvec_order1, {m, k}, 0, 1, 0, "mju_mulMatVec (double)", matvec_mujoco, 0}, \
    {"mat-vec " #m "x" #k ", order 2", big_setup, matvec_order2, {m, k}, 0, 1, 0, "mju_mulMatVec (double)", matvec_mujoco, 0}
#define SYM(name, run, k, n) {name, sym_setup, run, {k, n}, 0, 1, 0, "registers only", sym_roof, 0}
#define CLOTH {cloth_N, 128, 64, 32, cloth_n}

static const row table[] = {
    EIG(2, 62),
    {"eigen n = 3", small_setup, eig, {3}, RANDOM, MATRICES, 0, "mju_eig3 (double)", eig3_mujoco, 208},
    {"eigen n = 3, hard", small_setup, eig, {3}, HARD, MATRICES, 0, "mju_eig3 (double)", eig3_mujoco, 0},
    EIG(4, 473),
    EIG(6, 977),
    EIG(10, 3067),
    EIG(16, 7623),
    {"Cholesky and solve n = 10", small_setup, chol, {10}, POSITIVE, MATRICES, 0, "mju_chol (double)", chol_mujoco, 0},
    {"SPD exp n = 4", small_setup, spd_exp, {4}, POSITIVE, MATRICES, 0, NULL, NULL, 0},
    {"SPD exp n = 10", small_setup, spd_exp, {10}, POSITIVE, MATRICES, 0, NULL, NULL, 0},
    {"Adam on Stiefel 10x20", stiefel_setup, stiefel_update, {10, 20}, 0, 1, 0, NULL, NULL, 0},
    SPD(3),
    SPD(6),
    SPD(10),
    MATVEC(64, 64),
    MATVEC(128, 600),
    MATVEC(600, 128),
    SYM("A^T A, 4000 rows of 2800", sym_at, 4000, 2800),
    SYM("A^T A, 256 rows of 2800", sym_at, 256, 2800),
    SYM("A A^T, 400 rows of 12000", sym_bt, 12000, 400),
    SYM("large Cholesky n = 400", sym_chol, 0, 400),
    SYM("large Cholesky n = 2800", sym_chol, 0, 2800),
    {"... and one solution", sym_setup, sym_solve, {0, 2800}, 0, 1, 0, NULL, NULL, 0},
    {"softplus and slope, per element", big_setup, softplus, {LENGTH}, 0, LENGTH, 0, NULL, NULL, 0},
    {"latent dynamics n = 10, 64x2", plain_setup, plain_zdd, {10}, 0, 1, 10e-6, NULL, NULL, 0},
    {"... with a gyro layer", gyro_setup, gyro_zdd, {10}, 0, 1, 0, NULL, NULL, 0},
    {"... with the Cholesky head", delan_setup, delan_zdd, {10}, 0, 1, 0, NULL, NULL, 0},
    {"16 joints, n = 4: inverse dynamics", arm_setup, arm_inverse_run, {16, 4}, 0, 1, 0, NULL, NULL, 0},
    {"16 joints, n = 4: inverse dynamics, C(z,zd) w", arm_setup, arm_inverse_run, {16, 4}, 1, 1, 0, NULL, NULL, 0},
    {"16 joints, n = 4: apparent inertia", arm_setup, arm_inertia_run, {16, 4}, 0, 1, 0, NULL, NULL, 0},
    {"16 joints, n = 4: linearisation, rk4", arm_setup, arm_linear_run, {16, 4}, 0, 1, 0, NULL, NULL, 0},
    {"16 joints, n = 4: PD+ tick with guard", arm_setup, arm_control_run, {16, 4}, 0, 1, 0, NULL, NULL, 0},
    {"cloth encode", tick_setup, tick_encode, CLOTH, 0, 1, 0, NULL, NULL, 0},
    {"cloth step, euler", tick_setup, tick_step, CLOTH, 0, 1, 0, NULL, NULL, 0},
    {"cloth decode", tick_setup, tick_decode, CLOTH, 0, 1, 0, NULL, NULL, 0},
    {"cloth encode + step + decode", tick_setup, tick_all, CLOTH, 0, 1, 30e-6, NULL, NULL, 0},
    {"cloth reduce a force", tick_setup, tick_reduce, CLOTH, 0, 1, 0, NULL, NULL, 0},
    {"cloth training, batch 128, euler", fall_begin, fall_learn, CLOTH, 128, 1, 165e-3, NULL, NULL, 0},
    {"16-8-4 training, batch 64, euler", small_begin, small_learn, {16, 8, 4}, 64, 1, 5e-3, NULL, NULL, 0},
    {"16-8-4 training, batch 64, rk4", small_rk4_begin, small_rk4_learn, {16, 8, 4}, 64, 1, 0, NULL, NULL, 0},
};

int main(int argc, char **argv)
{
    const char *only = argc > 1 ? argv[1] : "";
    size_t i;
    printf("roln " ROLN_VERSION ", float, one thread, vectors of %d\n%-36s %11s %11s\n", ROLNI_LANES, "", "minimum", "median");
    for (i = 0; i < sizeof table / sizeof *table; i++)
        if (strstr(table[i].name, only)) print_row(table + i);
    if (!strstr("cost against N", only)) return 0;
    printf("\ncost against N: autoencoder N, 64, 10, euler; training: H = 8, batch 64, per window\n"
           "%8s %14s %10s %14s %10s\n", "N", "tick", "/ N", "training", "/ N");
    for (i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        const row r = {"cost against N", sizes[i].begin, sizes[i].predict, {0}, 64, 1, 0, NULL, NULL, 0};
        void (*const run[])(const row *) = {sizes[i].predict, sizes[i].learn};
        timing t[2];
        seed = 1;
        r.setup(&r);
        measure(&r, 1, run, t), measure(&r, 1, run + 1, t + 1);
        printf("%8d   ", sizes[i].N);
        print_time(t[0].min);
        printf(" %7.2f ns   ", 1e9 * t[0].min / sizes[i].N);
        print_time(t[1].min / r.more);
        printf(" %7.1f ns\n", 1e9 * t[1].min / r.more / sizes[i].N);
        fflush(stdout);
    }
    return 0;
}
