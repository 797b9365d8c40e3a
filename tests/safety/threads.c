/* SPDX-License-Identifier: MIT */
/* threads.c - several threads on one constant model, each with scratch of its own: the bits of what they compute are those of one
   thread. Training contexts apart from each other; two threads that fill the rows, and the sums, of one step of Gauss-Newton, as
   roln.h allows. Built with the thread sanitizer, which ends the program where two threads meet. */
#include <pthread.h>
#include "threads.h"
#include "unit/check.h"

enum { THREADS = 4, ROUNDS = 100, UPDATES = 30, SAMPLES = 64 };

/* What a thread is given, and what it makes. */
typedef struct {
    int number;
    scratch work;
    results o;
    arm_params p;
    arm_gradient g;
    arm_optimiser opt;
    unsigned long long statuses;
    double room; /* that neighbours are not in one line of the cache */
} context;

static context alone[THREADS], together[THREADS];
static roln_real q[SAMPLES * arm_N], qd[SAMPLES * arm_N];
static pthread_barrier_t gate;

static void predict(context *c)
{
    int i, k;
    begin((uint64_t)c->number, &c->o);
    for (i = 0; i < ROUNDS; i++)
        for (k = 0; k < CALLS; k++)
            call(k == ENCODE ? TICK : k == TICK ? ENCODE : k, &c->o, &c->work);
}

static void train(context *c)
{
    static const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 0};
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    int i;
    c->p = p;
    for (i = 0; i < UPDATES; i++) {
        const int start[4] = {c->number, 7 + i, 20, 40};
        const roln_batch b = {4, 3, 1, start, q, qd, NULL, NULL};
        memset(&c->g, 0, sizeof c->g);
        c->statuses += arm_grad(&c->p, &weights, &b, limits.dt, &c->g, &c->work.train.grad) != ROLN_OK;
        c->statuses += arm_update(&c->p, &opt, &c->opt, &c->g, &c->work.train.update) != ROLN_OK;
    }
}

static void *run(void *of)
{
    pthread_barrier_wait(&gate);
    predict(of);
    train(of);
    return NULL;
}

static void test_alike(void)
{
    pthread_t thread[THREADS];
    int k;
    for (k = 0; k < THREADS; k++) {
        alone[k].number = together[k].number = k;
        predict(alone + k), train(alone + k);
    }
    CHECK(pthread_barrier_init(&gate, NULL, THREADS) == 0);
    for (k = 0; k < THREADS; k++)
        CHECK(pthread_create(thread + k, NULL, run, together + k) == 0);
    for (k = 0; k < THREADS; k++) {
        CHECK(pthread_join(thread[k], NULL) == 0);
        CHECK(alone[k].o.statuses == 0 && alone[k].statuses == 0);
        CHECK(memcmp(&alone[k].o, &together[k].o, sizeof together[k].o) == 0);
        CHECK(memcmp(&alone[k].p, &together[k].p, sizeof together[k].p) == 0);
        CHECK(memcmp(&alone[k].opt, &together[k].opt, sizeof together[k].opt) == 0);
        CHECK(memcmp(&alone[k].p, &alone[(k + 1) % THREADS].p, sizeof p) != 0); /* they did not all do the same */
        CHECK(memcmp(&alone[k].o.s, &alone[(k + 1) % THREADS].o.s, sizeof alone[k].o.s) != 0);
    }
}

/* ---- one step of two threads ---- */

static const roln_newton_opt newton_opt = {1, 1, 0, NULL};
static arm_residuals rows[2];
static arm_newton newton[2];
static arm_train half_work[2];
static roln_real sums_work[2][ROLN_SYM_WORK];
static unsigned long long half_statuses[2];

static void fill(int half, arm_residuals *to)
{
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    const int start[4] = {half, 10 + half, 20 + half, 30 + half};
    const roln_batch b = {4, 3, 1, start, q, qd, NULL, NULL};
    half_statuses[half] += arm_rows(&p, &weights, &b, limits.dt, 4 * half, 0, to, &half_work[half].rows) != ROLN_OK;
}

static void add_up(int half, const arm_residuals *of, arm_newton *to)
{
    const int side = ROLN_NEWTON_SIDE(8, arm_newton_size);
    arm_newton_normal_equations(&newton_opt, 8, half ? side / 2 : 0, half ? side : side / 2, of, to, sums_work[half]);
}

static void *run_half(void *of)
{
    const int half = *(const int *)of;
    fill(half, rows + 1);
    if (pthread_barrier_wait(&gate) == PTHREAD_BARRIER_SERIAL_THREAD)
        half_statuses[0] += arm_newton_rows(&p, &newton_opt, 8, rows + 1, newton + 1) != ROLN_OK;
    pthread_barrier_wait(&gate);
    add_up(half, rows + 1, newton + 1);
    return NULL;
}

static void test_step(void)
{
    static const int half[2] = {0, 1};
    const roln_newton start = ROLN_NEWTON_START;
    pthread_t thread[2];
    int k;
    newton[0].state = newton[1].state = start;
    fill(0, rows), fill(1, rows);
    CHECK(arm_newton_rows(&p, &newton_opt, 8, rows, newton) == ROLN_OK);
    add_up(0, rows, newton), add_up(1, rows, newton);
    CHECK(pthread_barrier_destroy(&gate) == 0 && pthread_barrier_init(&gate, NULL, 2) == 0);
    for (k = 0; k < 2; k++)
        CHECK(pthread_create(thread + k, NULL, run_half, (void *)(size_t)(const void *)(half + k)) == 0);
    for (k = 0; k < 2; k++)
        CHECK(pthread_join(thread[k], NULL) == 0);
    for (k = 0; k < 2; k++)
        CHECK(half_statuses[k] == 0 && arm_newton_step(&p, &newton_opt, 8, rows + k, newton + k) == ROLN_OK);
    CHECK(memcmp(rows, rows + 1, sizeof *rows) == 0 && memcmp(&newton[0].next, &newton[1].next, sizeof p) == 0);
    CHECK(memcmp(newton[0].S, newton[1].S, sizeof newton[0].S) == 0 && memcmp(&newton[0].next, &p, sizeof p) != 0);
}

int main(void)
{
    uint64_t seed = 3;
    int i;
    make_model();
    for (i = 0; i < SAMPLES * arm_N; i++)
        q[i] = roln_uniform(&seed) - ROLN_C(0.5), qd[i] = roln_uniform(&seed) - ROLN_C(0.5);
    test_alike();
    test_step();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
