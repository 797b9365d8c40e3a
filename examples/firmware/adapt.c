/* SPDX-License-Identifier: MIT */
/* adapt.c - a model trained on the PC goes on learning on the board, a bounded piece of work per tick, and survives resets.

   The machine has changed: the four rods behind the second free joint have become 20 % heavier. It moves as rods.h says; the
   learner sees q, qd of every tick, and whether somebody has moved the chain. It changes P weights, the output layers of the mass
   and of the potential network and the biases before them, by recursive Gauss-Newton (roln_riem.h, section 7): a sample makes a
   row, is used in one step and forgotten; what stays of it is in the sums A [P][P]. These begin with a diagonal, which holds the
   weights where the samples say nothing: a Kalman filter of weights that are constant but unknown.

   A turn begins with a window of motion, WINDOW ticks. Now and then a window is held out: it is kept as a start and an end, and
   never learned from. Each region of the motion has its EACH last ones. The first must be of good data, until there are LEAST.
   Nothing is decided while those that one stretch of BAD_MOST ticks can touch, the first apart, are half of all. Every other
   window gives ROWS rows. If the weights in use predict its end far worse than most held-out windows, its data are bad or the
   machine has changed, and it is not learned from. Else these follow, each in a tick of its own: the sums, a step, the samples that
   test the step, the roll-out of each held-out window with the new weights, and the save. A step that its samples refuse is tried
   again with more damping, TRIES times in all.

   The new weights are taken if errors on the held-out windows do not grow in sum (held_out.h). Else the weights in use stay, and
   the rows still count in the next step. If more than half of the held-out windows are predicted far worse than before, the
   machine has changed, and learning begins with empty sums; so it does after REFUSALS in a row. The weights in use are the last
   good ones.

   All that a turn changes is saved at its end. After a reset or a power cut the program goes on from the last save, so that what
   followed it is done again, at most a turn unless windows were dropped; what it learned is the same to the last bit, however
   often it was reset. (Here the machine waits, too: its state is saved. A real one moves on, and the samples of a turn are lost.)

   Prints errors after 250 ms and after 1 s, relative to the motion: those of the trained model along the motion of the chain as it
   was, then those of the adapting model along the motion of the heavier one; and a hash of all that was learned. Errors are
   summed in double, here in software; learning itself has no double. */

#define ROLN_BLOCK 1 /* one sample at a time: little scratch */
#define ROLN_GN_ROWS 1
#include "rods.h"
#include "chain_weights.h"
#include "held_out.h"
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
    WINDOW = 30, STEP_TICKS = 5,                  /* ticks of a window, of a step of its roll-out */
    EVERY = 2, ROWS = (WINDOW - 4) / EVERY + 1,   /* ticks between samples; samples of a turn */
    JUDGES = 8, TRIES = 8,                        /* samples that test a step; steps that a turn tries */
    REGIONS = 4, EACH = 4, HELD = REGIONS * EACH, /* held-out windows */
    LEAST = 8,                                    /* nothing is learned with fewer */
    OLD = 24000,                                  /* ticks after which a held-out window is dropped */
    BAD_MOST = 1600, SPAN = BAD_MOST + WINDOW,    /* ticks of bad data that decide nothing; their windows end within SPAN */
    REFUSALS = 100,                               /* turns refused in a row, after which learning begins anew */
    TICKS = 4000, REPORT = 1000,
    PUSH = 54,                                    /* ticks after which somebody moves the chain elsewhere */
    TEST_STEPS = 40
};
#define TICK 0.005f  /* s */
#define STIFF 3e-4f  /* the diagonal that A begins with, in parts of the mean of that of the first turn */

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
typedef char rows_are_at_least_P_8[8 * ROWS >= P ? 1 : -1]; /* else the system would be that of the rows */
static const roln_block table[] = {{ROLN_EUCLIDEAN, 1, P, 0}};
static const roln_newton_opt newton = {300, 1, 5, NULL}; /* rows fade within some minutes */
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

/* Motion over WINDOW ticks. No torques: none act here. */
typedef struct {
    chain_latent start;
    float end[N], error; /* joints at the end; error of the roll-out with the weights in use, rad */
    uint32_t tick, sure; /* that behind its end, 0: no window; 1: one of the first */
} window;

/* All that a reset must not lose. */
typedef struct {
    uint32_t tick, samples; /* samples: since somebody last moved the chain */
    uint64_t seed;
    chain_params model;              /* the weights in use, the last good ones */
    window held[HELD];               /* EACH of each region */
    float good;                      /* least median of their errors since learning began anew; 0: none yet */
    uint32_t full;                   /* 1: there have been LEAST held-out windows */
    uint32_t begun, refusals;        /* turns in A; refused in a row */
    uint32_t accepted, refused, left_out, anew; /* turns; changes of the machine */
    roln_newton state;
    float A[P * (P + 1)], older[P]; /* the J^T r of earlier turns that no step has used yet, faded as A */
    chain_state last[4];            /* of the ticks before, the newest first */
    rods machine;
} memory;

static kept_mark marks[2] KEPT;
static memory copies[2] KEPT;
static uint64_t origin; /* sum of the weights that learning begins with: what others began with is not gone on with */

/* A turn: done again after a reset. */
typedef enum { SAMPLE, LOOK, SUMS, STEP, JUDGE, COMPARE, SAVE, PHASES } phases;
static struct {
    phases phase;
    int age, hold_out, rows, tries, compared; /* age: ticks of the window so far */
    window seen;
    float lambda, errors[HELD]; /* lambda before the turn; errors of the held-out windows with the weights `next` */
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
static roln_status sample(const memory *m, const chain_state *x)
{
    const int k = turn.rows++;
    memcpy(turn.q[k], m->last[1].q, sizeof turn.q[k]);
    memcpy(turn.qd[k], m->last[1].qd, sizeof turn.qd[k]);
    for (int i = 0; i < N; i++)
        turn.qdd[k][i] = (8 * (m->last[0].qd[i] - m->last[2].qd[i]) - (x->qd[i] - m->last[3].qd[i])) / (12 * TICK);
    return row(m, &m->model, k, turn.J + k * P, turn.r + k);
}

/* The error of a roll-out: root of the mean square over the joints at its end, rad. */
static float roll(const chain_params *p, const window *w)
{
    chain_latent s = w->start;
    chain_state y;
    float sum = 0;
    for (int k = 0; k < WINDOW / STEP_TICKS; k++)
        if (chain_step(p, &s, NULL, STEP_TICKS * TICK, &scratch.work.step) != ROLN_OK) return HELD_FAILED;
    if (chain_decode(p, &s, &y, &scratch.work.decode) != ROLN_OK) return HELD_FAILED;
    for (int i = 0; i < N; i++)
        sum += (y.q[i] - w->end[i]) * (y.q[i] - w->end[i]);
    return sum < HELD_FAILED ? ROLN_SQRT(sum / N) : HELD_FAILED;
}

/* Ticks since it ended. */
static uint32_t age_of(const memory *m, const window *w)
{
    return w->tick > 0 ? m->tick - w->tick : UINT32_MAX;
}

/* Errors of the held-out windows, [HELD], those with the weights in use and, unless it is NULL, those of `next`. Returns how
   many. */
static int errors_of(const memory *m, float *now, float *next)
{
    int count = 0;
    for (int i = 0; i < HELD; i++) {
        if (m->held[i].tick == 0) continue;
        if (next) next[count] = turn.errors[i];
        now[count++] = m->held[i].error;
    }
    return count;
}

/* Begin with empty sums, from the weights in use. */
static void begin_anew(memory *m)
{
    memset(m->A, 0, sizeof m->A);
    memset(m->older, 0, sizeof m->older);
    m->state.lambda = 1e-6f; /* A has its diagonal */
    m->begun = m->refusals = 0, m->good = 0;
}

/* The weights stay. The rows of the turn still ask for a step. After REFUSALS in a row all rows are forgotten. */
static void refuse(memory *m)
{
    for (int i = 0; i < P; i++) {
        m->older[i] *= 1 - 1 / newton.memory;
        for (int k = 0; k < ROWS; k++)
            m->older[i] += turn.J[k * P + i] * turn.r[k];
    }
    roln_newton_give_up(turn.lambda, &m->state);
    m->begun++, m->refused++;
    if (++m->refusals == REFUSALS) begin_anew(m);
    turn.phase = SAVE;
}

static void drop_old(memory *m)
{
    for (int i = 0; i < HELD; i++)
        if (age_of(m, &m->held[i]) > OLD) m->held[i].tick = 0;
}

/* Nonzero: the next window is to be held out, as each one at first. Later they are so far apart that, while their number stays,
   fewer than half are in one SPAN. */
static int is_held_out(const memory *m)
{
    uint32_t last = UINT32_MAX, count = 0;
    for (int i = 0; i < HELD; i++) {
        const uint32_t age = age_of(m, &m->held[i]);
        count += age < UINT32_MAX;
        if (age < last) last = age;
    }
    return !m->full || last > SPAN / ((count < LEAST ? LEAST : count) / 2 - 1);
}

/* Nonzero if there are LEAST windows, and a stretch of BAD_MOST ticks touches fewer than half of them, wherever it is. */
static int may_decide(const memory *m)
{
    int count = 0, most = 0;
    for (int i = 0; i < HELD; i++) {
        int near = 0; /* those that end at or within SPAN after this one */
        for (int k = 0; k < HELD && m->held[i].tick > 0; k++)
            near += m->held[k].tick > 0 && !m->held[k].sure && m->held[k].tick - m->held[i].tick < SPAN;
        count += m->held[i].tick > 0;
        if (near > most) most = near;
    }
    return count >= LEAST && most < count / 2;
}

/* x measured. A window that the chain was moved in, or with a number that is not finite, is dropped. */
static void watch(memory *m, const chain_state *x)
{
    if (m->samples == 0 || !roln_all_finite(N, x->q) || !roln_all_finite(N, x->qd)) turn.age = 0;
    if (turn.age == 0) {
        turn.rows = 0;
        drop_old(m);
        turn.hold_out = is_held_out(m);
        if (chain_encode(&m->model, x, &turn.seen.start, &scratch.work.encode) == ROLN_OK) turn.age = 1;
        return;
    }
    if (!turn.hold_out && turn.age >= 4 && (WINDOW - turn.age) % EVERY == 0 && sample(m, x) != ROLN_OK) {
        turn.age = 0;
        return;
    }
    if (turn.age++ < WINDOW) return;
    turn.age = 0;
    memcpy(turn.seen.end, x->q, sizeof turn.seen.end);
    turn.phase = LOOK;
}

/* The signs of z. */
static int region_of(const chain_latent *s)
{
    return (s->z[0] > 0) + 2 * (s->z[1] > 0);
}

/* The window takes the place of the oldest one of the region that it starts in. */
static void hold_out(memory *m)
{
    window *region = m->held + EACH * region_of(&turn.seen.start), *oldest = region;
    float now[HELD];
    for (int i = 1; i < EACH; i++)
        if (age_of(m, region + i) > age_of(m, oldest)) oldest = region + i;
    *oldest = turn.seen;
    oldest->sure = !m->full;
    const int count = errors_of(m, now, NULL);
    const float median = held_median(count, now);
    if (count >= LEAST) m->full = 1;
    if (!may_decide(m)) return;
    if (m->good > 0 && median > HELD_FAR * m->good) begin_anew(m), m->anew++;
    if (m->good == 0) m->good = median;
}

/* The weights in use predict the window: hold it out, learn from it, or leave it out. */
static void look(memory *m)
{
    float now[HELD];
    const int count = errors_of(m, now, NULL);
    turn.seen.tick = m->tick;
    turn.seen.error = roll(&m->model, &turn.seen);
    turn.phase = SAVE;
    if (turn.hold_out) hold_out(m);
    else if (may_decide(m) && held_near(turn.seen.error, count, now)) turn.phase = SUMS;
    else m->left_out++;
}

static void sums(memory *m)
{
    float trace = 0;
    memcpy(turn.J + ROWS * P, m->older, sizeof m->older);
    turn.lambda = m->state.lambda, turn.tries = 0;
    if (roln_newton_rows(1, table, &newton, ROWS, NULL, turn.J, turn.r, turn.weight, &m->state, scratch.sums) != ROLN_OK) {
        if (!roln_all_finite(P, m->older)) begin_anew(m); /* it would fail in all turns */
        turn.phase = SAMPLE;
        return;
    }
    roln_newton_normal_equations(&newton, ROWS, P, 0, P, turn.J, m->A, scratch.sums);
    for (int i = 0; i < P && m->begun == 0; i++)
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
    turn.compared = 0;
    if (roln_newton_step(1, table, &newton, &g, x, &m->state, next, turn.expect, turn.keep, scratch.step) != ROLN_OK) {
        refuse(m);
        return;
    }
    put_in(next, turn.next.theta + chain_ae_size);
    turn.phase = JUDGE;
}

/* Is the step what the rows foretold? */
static void judge(memory *m)
{
    for (int k = 0; k < JUDGES; k++)
        (void)row(m, &turn.next, k, NULL, turn.there + k); /* where it fails: infinite */
    if (roln_newton_accept(JUDGES, turn.r, turn.weight, turn.expect, turn.there, &m->state)) turn.phase = COMPARE;
    else if (++turn.tries < TRIES) turn.phase = STEP;
    else refuse(m);
}

/* Do errors on the held-out windows not grow? */
static void compare(memory *m)
{
    const int k = turn.compared;
    float now[HELD], next[HELD];
    turn.errors[k] = m->held[k].tick > 0 ? roll(&turn.next, &m->held[k]) : 0;
    if (++turn.compared < HELD) return;
    const int count = errors_of(m, now, next);
    if (!held_no_worse(count, now, next)) {
        refuse(m);
        return;
    }
    m->model = turn.next;
    memcpy(m->older, turn.keep, sizeof m->older);
    for (int i = 0; i < HELD; i++)
        m->held[i].error = turn.errors[i];
    const float median = held_median(count, next);
    if (m->good == 0 || median < m->good) m->good = median;
    m->accepted++, m->begun++, m->refusals = 0;
    turn.phase = SAVE;
}

/* One tick of the learner, x measured; NULL: not, or the guard reports a fault. Then the window is dropped, also one that has just
   ended. Returns the copy to work on. */
static int tick(int copy, const chain_state *x)
{
    memory *m = &copies[copy];
    const phases now = !x && (turn.phase == LOOK || turn.phase == SUMS) ? SAMPLE : turn.phase;
    turn.phase = now;
    if (now == SAMPLE && x) watch(m, x);
    if (now == LOOK) look(m);
    if (now == SUMS) sums(m);
    if (now == STEP) step(m);
    if (now == JUDGE) judge(m);
    if (now == COMPARE) compare(m);
    m->tick++, m->samples++;
    if (!x) turn.age = 0;
    else memmove(m->last + 1, m->last, 3 * sizeof *m->last), m->last[0] = *x;
    if (now != SAVE) return copy;
    turn.phase = SAMPLE;
    return kept_save(marks, copies, (int)sizeof *copies, copy, origin);
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
        chain_state x, y = {{0}, {0}};
        chain_latent s;
        roln_status st;
        move(&machine, &seed);
        rods_read(&machine, &x);
        st = chain_encode(model, &x, &s, &scratch.work.encode);
        for (int k = 1; k <= TEST_STEPS && st == ROLN_OK; k++) {
            const int late = k > TEST_STEPS / 4;
            for (int i = 0; i < STEP_TICKS; i++)
                rods_step(&machine, mass, NULL, TICK);
            st = chain_step(model, &s, NULL, STEP_TICKS * TICK, &scratch.work.step);
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
    static const roln_newton state = ROLN_NEWTON_START;
    memset(m, 0, sizeof *m);
    m->model = chain_weights;
    m->state = state;
    begin_anew(m);
    m->seed = SEED;
}

int main(void)
{
    static const char *const names[PHASES] = {"sample ", ", look ", ", sums ", ", step ", ", judge ", ", compare ", ", save "};
    uint32_t most[PHASES] = {0, 0, 0, 0, 0, 0, 0};
    int copy;
    origin = roln_fnv((int)sizeof chain_weights, (const unsigned char *)&chain_weights, ROLN_FNV);
    copy = kept_open(marks, copies, (int)sizeof *copies, origin);
    if (chain_model.lnn.mass_net.size[chain_model.lnn.mass_net.layers - 1] != LAST) return 1;
    if (copy < 0) {
        start(&copies[0]);
        put_text("start\ntrained   ");
        test(&copies[0].model, before);
        copy = kept_save(marks, copies, (int)sizeof *copies, 0, origin);
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
    put_text("turns accepted ");
    put_integer(copies[copy].accepted, 0);
    put_text(", refused ");
    put_integer(copies[copy].refused, 0);
    put_text(", left out ");
    put_integer(copies[copy].left_out, 0);
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
