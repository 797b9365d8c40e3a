/* SPDX-License-Identifier: MIT */
/* adapt.c - a model trained on the PC goes on learning in the controller, a bounded piece of work per tick, and survives resets.

   The machine has changed: the four rods behind the second free joint have become 20 % heavier. It moves as rods.h says; the
   learner sees q, qd of every tick, nothing else. It changes P weights, the output layers of the mass and of the potential network
   and the biases before them, by recursive Gauss-Newton (roln_riem.h, section 7): a sample makes a row, is used in one step and
   forgotten; what stays of it is in the sums A [P][P]. These begin with a diagonal, which holds the weights where the samples say
   nothing: a Kalman filter of weights that are constant but unknown.

   Every EVERY-th tick takes a sample and makes its row. ROWS of them are a turn, which ends with one tick each for the sums, for
   the step, for every sample that judges the step, and for the save. A step that is refused is taken again with more damping. After
   a reset the program goes on from the last save, so that at most a turn is done again; what it learned is the same to the last
   bit, however often it was reset. (Here the machine waits, too: its state is saved. A real one moves on, and the samples of a turn
   are lost.)

   Prints errors after 250 ms and after 1 s, relative to the motion: those of the trained model along the motion of the chain as it
   was, then those of the adapting model along the motion of the heavier one; and a hash of all that was learned. Errors are
   summed in double, here in software; learning itself has no double. */

#define ROLN_BLOCK 1 /* one sample at a time: little scratch */
#define ROLN_GN_ROWS 1
#include "rods.h"
#include "chain_weights.h"
#include "kept.h"
#include "text.h"

#ifndef SEED
#define SEED 1
#endif
#ifndef TESTS
#define TESTS 50 /* roll-outs that judge it */
#endif

enum {
    N = chain_N, n = chain_n,
    ROWS = 20, EVERY = 3,       /* samples of a turn, ticks between them */
    JUDGES = 8,                 /* of them */
    TICKS = 2000, REPORT = 500,
    PUSH = 50,                  /* ticks after which somebody moves the chain elsewhere */
    TEST_STEPS = 40 /* of 25 ms */
};
#define TICK 0.005f  /* s */
#define STIFF 3e-4f  /* the diagonal that A begins with, in parts of the mean of that of the first turn */
#define GIVE_UP 0.1f /* lambda: a turn that no step fits is left, and makes A stiffer */

static const float before[N] = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f}; /* kg */
static const float after[N] = {0.1f, 0.1f, 0.1f, 0.1f, 0.12f, 0.12f, 0.12f, 0.12f};

/* ---- what is learned ---- */

/* The bias of the last hidden layer and, behind it, the matrix of the output layer, whose own bias ends the network. */
enum {
    LAST = 16, /* width of that layer, as in chain.h */
    MASS = LAST + LAST * n * (n + 1) / 2,
    POTENTIAL = LAST + LAST,
    P = MASS + POTENTIAL
};
static const roln_block table[] = {{ROLN_EUCLIDEAN, 1, P, 0}};
static const roln_newton_opt newton = {1e6f, 1, 5, NULL}; /* forgets nothing */
static const roln_loss loss = {.zdd = 1};

/* Where they lie among the numbers of both networks. */
static int mass_at(void)
{
    return roln_mlp_params(&chain_model.lnn.mass_net) - n * (n + 1) / 2 - MASS;
}

static int potential_at(void)
{
    return roln_mlp_params(&chain_model.lnn.mass_net) + roln_mlp_params(&chain_model.lnn.potential_net) - 1 - POTENTIAL;
}

/* x [P] from the networks [chain_net_size], and back. */
static void take_out(const float *networks, float *x)
{
    memcpy(x, networks + mass_at(), MASS * sizeof *x);
    memcpy(x + MASS, networks + potential_at(), POTENTIAL * sizeof *x);
}

static void put_in(const float *x, float *networks)
{
    memcpy(networks + mass_at(), x, MASS * sizeof *x);
    memcpy(networks + potential_at(), x + MASS, POTENTIAL * sizeof *x);
}

/* ---- memory ---- */

/* All that a reset must not lose. */
typedef struct {
    uint32_t tick, samples; /* samples: since somebody last moved the chain */
    uint64_t seed;
    chain_params model;
    roln_newton state;
    float A[P * (P + 1)], older[P]; /* what samples of the turns before still ask for */
    chain_state last[4];            /* of the ticks before, the newest first */
    rods machine;
} memory;

static kept_mark marks[2] KEPT;
static memory copies[2] KEPT;

/* A turn: done again after a reset. */
typedef enum { SAMPLE, SUMS, STEP, JUDGE, SAVE, PHASES } phases;
static struct {
    phases phase;
    int rows, judged;
    float q[ROWS][N], qd[ROWS][N], qdd[ROWS][N];
    float J[(ROWS + 1) * P], r[ROWS], weight[ROWS], expect[ROWS], there[ROWS], keep[P];
    chain_params next; /* where the step ends */
} turn;

static union {
    chain_train train;
    chain_work work;
    float sums[ROLN_SYM_WORK], step[ROLN_NEWTON_STEP_WORK(ROWS, P, 0)];
} scratch;

/* ---- learning ---- */

/* Sample k of the turn: its residual r at the weights p and, unless J is NULL, its row J [P]. */
static roln_status row(const memory *m, const chain_params *p, int k, float *J, float *r)
{
    static chain_residuals one;
    const roln_batch b = {.count = 1, .stride = 1, .start = &k, .q = turn.q[0], .qd = turn.qd[0], .qdd = turn.qdd[0]};
    roln_status st;
    one.seed = m->state.taken * ROWS + (uint32_t)k;
    st = chain_rows(p, &loss, &b, 0, 0, !J, &one, &scratch.train.rows);
    *r = J ? one.r[0] : one.next[0];
    if (st == ROLN_OK && J) take_out(one.J, J);
    return st;
}

/* The sample two ticks ago, with the central difference of qd of fourth order. */
static void sample(const memory *m, const chain_state *x)
{
    const int k = turn.rows;
    memcpy(turn.q[k], m->last[1].q, sizeof turn.q[k]);
    memcpy(turn.qd[k], m->last[1].qd, sizeof turn.qd[k]);
    for (int i = 0; i < N; i++)
        turn.qdd[k][i] = (8 * (m->last[0].qd[i] - m->last[2].qd[i]) - (x->qd[i] - m->last[3].qd[i])) / (12 * TICK);
    if (row(m, &m->model, k, turn.J + k * P, turn.r + k) == ROLN_OK) turn.rows++;
    if (turn.rows == ROWS) turn.phase = SUMS;
}

static void sums(memory *m)
{
    float trace = 0;
    memcpy(turn.J + ROWS * P, m->older, sizeof m->older);
    if (roln_newton_rows(1, table, &newton, ROWS, NULL, turn.J, turn.r, turn.weight, &m->state, scratch.sums) != ROLN_OK) {
        turn.phase = SAMPLE, turn.rows = 0; /* not finite: another turn */
        return;
    }
    roln_newton_normal_equations(&newton, ROWS, P, 0, P, turn.J, m->A, scratch.sums);
    for (int i = 0; i < P && m->state.taken + m->state.refused == 0; i++)
        trace += m->A[i * (P + 2)];
    for (int i = 0; i < P; i++)
        m->A[i * (P + 2)] += STIFF * trace / P;
    turn.phase = STEP;
}

static void step(memory *m)
{
    static float x[P], next[P];
    const roln_newton_system g = {ROWS, P, turn.J, turn.r, m->A};
    take_out(m->model.theta + chain_ae_size, x);
    turn.next = m->model;
    turn.judged = 0;
    turn.phase = SAVE;
    if (roln_newton_step(1, table, &newton, &g, x, &m->state, next, turn.expect, turn.keep, scratch.step) != ROLN_OK) return;
    put_in(next, turn.next.theta + chain_ae_size);
    turn.phase = JUDGE;
}

static void judge(memory *m)
{
    (void)row(m, &turn.next, turn.judged, NULL, turn.there + turn.judged); /* where it fails: infinite */
    if (++turn.judged < JUDGES) return;
    turn.phase = SAVE;
    if (roln_newton_accept(JUDGES, turn.r, turn.weight, turn.expect, turn.there, &m->state)) {
        m->model = turn.next;
        memcpy(m->older, turn.keep, sizeof m->older);
    } else if (m->state.lambda < GIVE_UP) {
        turn.phase = STEP;
    }
}

/* One tick of the learner, x measured. Returns the copy to work on. */
static int tick(int copy, const chain_state *x)
{
    memory *m = &copies[copy];
    const phases now = turn.phase;
    if (now == SAMPLE && m->samples >= 4 && m->tick % EVERY == 0) sample(m, x);
    if (now == SUMS) sums(m);
    if (now == STEP) step(m);
    if (now == JUDGE) judge(m);
    m->tick++, m->samples++;
    memmove(m->last + 1, m->last, 3 * sizeof *m->last);
    m->last[0] = *x;
    if (now != SAVE) return copy;
    turn.phase = SAMPLE, turn.rows = 0;
    return kept_save(marks, copies, (int)sizeof *copies, copy);
}

/* ---- errors ---- */

/* Somewhere within the range of the training. */
static void move(rods *s, uint64_t *seed)
{
    for (int i = 0; i < n; i++) {
        s->z[i] = 1.4f * roln_uniform(seed) - 0.7f;
        s->zd[i] = 2 * roln_uniform(seed) - 1;
    }
}

/* sqrt(sum |q_model - q|^2 / sum |q|^2) at 250 ms and 1 s of roll-outs that the learning has not seen. */
static void test(const chain_params *model, const float mass[N])
{
    uint64_t seed = 99;
    float error[2] = {0, 0}, size[2] = {0, 0};
    for (int t = 0; t < TESTS; t++) {
        rods machine;
        chain_state x, y;
        chain_latent s;
        roln_status st;
        move(&machine, &seed);
        rods_read(&machine, &x);
        st = chain_encode(model, &x, &s, &scratch.work.encode);
        for (int k = 1; k <= TEST_STEPS && st == ROLN_OK; k++) {
            const int late = k > TEST_STEPS / 4;
            for (int i = 0; i < 5; i++)
                rods_step(&machine, mass, NULL, TICK);
            st = chain_step(model, &s, NULL, 5 * TICK, &scratch.work.step);
            if (st == ROLN_OK) st = chain_decode(model, &s, &y, &scratch.work.decode);
            rods_read(&machine, &x);
            for (int i = 0; i < N && k % (late ? TEST_STEPS : TEST_STEPS / 4) == 0; i++) {
                error[late] += (y.q[i] - x.q[i]) * (y.q[i] - x.q[i]);
                size[late] += x.q[i] * x.q[i];
            }
        }
        if (st != ROLN_OK) error[0] = error[1] = 1e6f;
    }
    put_real(ROLN_SQRT(error[0] / size[0]), 4);
    put_real(ROLN_SQRT(error[1] / size[1]), 4);
    put_text("\n");
}

static void report(uint32_t at, const memory *m)
{
    put_text("tick ");
    put_integer(at, 5);
    test(&m->model, after);
}

/* ---- main ---- */

/* Of numbers only: not of the padding between them. */
static uint64_t hash_of(const memory *m)
{
    uint64_t h = roln_fnv((int)sizeof m->model, (const unsigned char *)&m->model, ROLN_FNV);
    h = roln_fnv((int)sizeof m->A, (const unsigned char *)m->A, h);
    return roln_fnv((int)sizeof m->older, (const unsigned char *)m->older, h);
}

static void start(memory *m)
{
    static const roln_newton anew = ROLN_NEWTON_START;
    memset(m, 0, sizeof *m);
    m->model = chain_weights;
    m->state = anew;
    m->state.lambda = 1e-6f; /* A has its diagonal */
    m->seed = SEED;
    put_text("start\ntrained   ");
    test(&m->model, before);
}

int main(void)
{
    static const char *const names[PHASES] = {"sample ", ", sums ", ", step ", ", judge ", ", save "};
    uint32_t most[PHASES] = {0, 0, 0, 0, 0};
    int copy = kept_open(marks, copies, (int)sizeof *copies);
    if (chain_model.lnn.mass_net.size[chain_model.lnn.mass_net.layers - 1] != LAST) return 1;
    if (copy < 0) {
        copy = 0;
        start(&copies[0]);
    } else {
        put_text("resumed at tick ");
        put_integer(copies[copy].tick, 0);
        put_text("\n");
    }
    while (copies[copy].tick < TICKS) {
        memory *m = &copies[copy];
        const phases now = turn.phase;
        chain_state x;
        if (m->tick % REPORT == 0) report(m->tick, m);
        if (m->tick % PUSH == 0) move(&m->machine, &m->seed), m->samples = 0;
        rods_step(&m->machine, after, NULL, TICK);
        rods_read(&m->machine, &x); /* "read the encoders" */
        const uint32_t count = board_count();
        copy = tick(copy, &x);
        const uint32_t used = board_count() - count;
        if (used > most[now]) most[now] = used;
    }
    report(TICKS, &copies[copy]);
    put_text("steps taken ");
    put_integer(copies[copy].state.taken, 0);
    put_text(", refused ");
    put_integer(copies[copy].state.refused, 0);
    put_text("\nhash ");
    put_hex(hash_of(&copies[copy]), 16);
    put_text("\ninstructions of a tick: ");
    for (int i = 0; i < PHASES; i++) {
        put_text(names[i]);
        put_integer(most[i], 0);
    }
    put_text("\n");
    return 0;
}
