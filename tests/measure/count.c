/* SPDX-License-Identifier: MIT */
/* count.c - what the kernels cost on a controller, in instructions (count.sh): each row over SAMPLES random inputs, mean and most,
   in the unit of its target, without what the counter itself takes. A line: name, mean, most, target, with tabs between. */
#define ROLN_NAME dynamics
#define ROLN_AE 4
#define ROLN_MLP 32, 32
#include "roln.h"

#include "pend16.h"

#define ROLN_NAME smooth16 /* pend16 with polynomials */
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_POLYNOMIALS 4, 7
#define ROLN_MASS squares, 6
#include "roln.h"

#include "text.h"

enum { SAMPLES = 64, MAX_N = 16, ROWS = 128, COLS = 600 };

/* One line of the table. */
typedef struct row row;
struct row {
    const char *name;
    void (*setup)(const row *), (*run)(const row *); /* run: what is counted */
    int size[2];
    float unit, target;                              /* the figure: instructions / unit */
};

static uint64_t seed = 1;

static void fill(int n, roln_real sd, roln_real *x)
{
    while (n-- > 0)
        *x++ = sd * roln_normal(&seed);
}

static void must(roln_status st)
{
    if (st == ROLN_OK) return;
    put_text("count: a status other than ROLN_OK\n");
    board_exit(1);
}

/* ---- kernels ---------------------------------------------------------------------------------- */

static roln_real A[ROWS * COLS], x[COLS], y[COLS];

static void matrix(const row *r)
{
    fill(r->size[0] * r->size[1], 1, A);
    fill(COLS, 1, x);
}

static void mm(const row *r)
{
    roln_mm(1, r->size[0], r->size[1], x, A, y);
}

static void mm_bt(const row *r)
{
    roln_mm_bt(1, r->size[1], r->size[0], x, A, y);
}

static const roln_mlp mlp = {3, {10, 64, 64, 10}, 0};
static roln_real weights[6 * 1024], slope[128], out[128];

static void network(const row *r)
{
    (void)r;
    roln_mlp_init(&mlp, 1, weights, &seed);
    fill(10, 1, x);
}

static void forward(const row *r)
{
    (void)r;
    roln_mlp_forward(&mlp, 1, 1, 1, weights, x, y, slope, out);
}

static roln_real l[MAX_N], Q[MAX_N * MAX_N], work[ROLN_EIG_WORK(MAX_N)];

static void symmetric(const row *r)
{
    const int n = r->size[0];
    for (int i = 0; i < n; i++)
        for (int j = 0; j <= i; j++)
            A[i * n + j] = A[j * n + i] = roln_normal(&seed);
}

static void eig(const row *r)
{
    must(roln_eig(r->size[0], A, l, Q, work));
}

/* ---- models ----------------------------------------------------------------------------------- */

#define DYNAMICS(x) dynamics_##x
static dynamics_params dyn;
static roln_real dyn_tape[ROLN_LNN_TAPE(DYNAMICS, 1, 0, 1)], dyn_work[ROLN_LNN_ZDD_WORK(DYNAMICS, 0, 1)];
static roln_real s[8], tau[4], zdd[4];

static void state(const row *r)
{
    (void)r;
    roln_lnn_init(&dynamics_model.lnn, dyn.theta, &seed);
    fill(8, 1, s), fill(4, 1, tau);
}

static void zdd_of(const row *r)
{
    (void)r;
    must(roln_lnn_zdd(&dynamics_model.lnn, 0, 1, dyn.theta, s, tau, zdd, dyn_tape, dyn_work));
}

static const roln_limits limits = {
    .dt = 0.001f, .residual = 1e9f, .tau = 1e9f, .hold = 5, .q_tolerance = 1e9f, .qd_tolerance = 1e9f};

/* NAME_pose: random parameters, at first, and a random state. NAME_ticks: encode, controller, lift, guard; the reference in motion,
   every check of the guard on and passed. */
#define CONTROLLER(M) \
    static M##_params M##_pend; \
    static struct { \
        M##_latent s; \
        M##_target ref; \
        M##_guard guard; \
        M##_state at; \
        union { \
            M##_start start; \
            M##_work work; \
        } of; \
    } M##_ctl; \
    static void M##_pose(const row *r) \
    { \
        enum { N = M##_N, n = M##_n }; \
        static roln_real q[64 * N], qd[64 * N], qbar[N]; \
        (void)r; \
        if (M##_pend.theta[0] == 0) { \
            fill(64 * N, 1, q), fill(64 * N, 1, qd); \
            must(M##_init_pod(&M##_pend, 64, q, qd, qbar, &seed, &M##_ctl.of.start.init_pod)); \
            for (int i = 0; i < n; i++) { \
                M##_pend.z_min[i] = -1e9f, M##_pend.z_max[i] = M##_pend.zd_max[i] = 1e9f; \
                M##_ctl.ref.kp[i] = M##_ctl.ref.kd[i] = 1; \
            } \
        } \
        fill(N, 1, M##_ctl.at.q), fill(N, 1, M##_ctl.at.qd); \
        fill(n, 1, M##_ctl.ref.z), fill(n, 1, M##_ctl.ref.zd), fill(n, 1, M##_ctl.ref.zdd); \
    } \
    static void M##_ticks(const row *r) \
    { \
        (void)r; \
        if (M##_tick(&M##_pend, &limits, &M##_ctl.at, &M##_ctl.ref, &M##_ctl.s, &M##_ctl.guard, &M##_ctl.of.work.tick) != 0) \
            must(ROLN_E_RANGE); \
    }
CONTROLLER(pend16)
CONTROLLER(smooth16)

/* A slice of the check of the parameters, within a pass. */
static roln_check check;

static void whole(const row *r)
{
    pend16_pose(r);
    memset(&check, 0, sizeof check);
    must(pend16_check(&pend16_pend, pend16_numbers, &check));
}

static void slice(const row *r)
{
    must(pend16_check(&pend16_pend, r->size[0], &check));
}

/* ---- table ------------------------------------------------------------------------------------ */

static const row table[] = {
    {"mat-vec 64 x 64, order 1, per multiply-add", matrix, mm, {64, 64}, 64 * 64, 2.5f},
    {"mat-vec 64 x 64, order 2, per multiply-add", matrix, mm_bt, {64, 64}, 64 * 64, 2.5f},
    {"mat-vec 128 x 600, order 1, per multiply-add", matrix, mm, {128, 600}, 128 * 600, 2.5f},
    {"mat-vec 128 x 600, order 2, per multiply-add", matrix, mm_bt, {128, 600}, 128 * 600, 2.5f},
    {"softplus MLP 10-64-64-10", network, forward, {0}, 1, 24000},
    {"eigensolver n = 3", symmetric, eig, {3}, 1, 955},
    {"eigensolver n = 6", symmetric, eig, {6}, 1, 7700},
    {"eigensolver n = 10", symmetric, eig, {10}, 1, 28800},
    {"eigensolver n = 16", symmetric, eig, {16}, 1, 96000},
    {"forward dynamics n = 4, 32 x 2", state, zdd_of, {0}, 1, 45000},
    {"control tick of pend16, 16 joints, 32 x 2", pend16_pose, pend16_ticks, {0}, 1, 90000},
    {"the same, polynomials of degree 4 and 7", smooth16_pose, smooth16_ticks, {0}, 1, 90000},
    {"check of parameters, 16 numbers, per byte", whole, slice, {16}, 64, 8},
    {"check of parameters, 256 numbers, per byte", whole, slice, {256}, 1024, 8},
};

static void nothing(const row *r)
{
    (void)r;
}

static uint32_t count(void (*volatile run)(const row *), const row *r)
{
    const uint32_t before = board_count();
    run(r);
    return board_count() - before;
}

int main(void)
{
    for (unsigned i = 0; i < sizeof table / sizeof *table; i++) {
        const row *r = table + i;
        const int places = r->unit > 1 ? 3 : 0;
        float sum = 0, most = 0;
        r->setup(r), r->run(r);
        for (int k = 0; k < SAMPLES; k++) {
            r->setup(r);
            const uint32_t empty = count(nothing, r);
            const float used = (float)(count(r->run, r) - empty);
            sum += used;
            most = used > most ? used : most;
        }
        put_text(r->name);
        put_text("\t");
        put_real(sum / (SAMPLES * r->unit), places);
        put_text("\t");
        put_real(most / r->unit, places);
        put_text("\t");
        put_real(r->target, r->unit > 1 ? 1 : 0);
        put_text("\n");
    }
    return 0;
}
