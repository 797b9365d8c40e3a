/* adapt.c - a model trained on the PC goes on learning in the controller, a bounded piece of work per tick, and survives resets.

   The machine has changed: gravity, say, is 30 % stronger than in the recordings of the training. It is simulated by the same model
   with another unit of time: in a pendulum that is all that gravity sets. The learner sees q, qd of every tick, nothing else. Its
   autoencoder stays, since the joints have not changed; mass matrix and potential learn from the acceleration loss.

   Every tick measures, and every fourth sample goes into a ring. Then, in turn, a tick adds the gradient of one sample of the ring
   (BATCH ticks), makes an update (one tick), saves (one tick). After a reset the program goes on from the last save, so that at
   most a turn is done again; what it learned is the same to the last bit, however often it was reset. (Here the machine waits,
   too: its state is saved. A real one moves on, and the samples of a turn are lost.)

   Prints the error of the adapting model along roll-outs of 0.25 s, relative to the motion, and a hash of all that was learned. */

#define ROLN_BLOCK 1 /* one sample at a time: little scratch */
#include "chain.h"
#include "chain_weights.h"
#include "kept.h"
#include "text.h"

enum {
    N = chain_N, n = chain_n,
    BATCH = 10, TURN = BATCH + 2,
    TICKS = 1200, REPORT = 300,
    PUSH = 400,            /* ticks after which somebody moves the chain elsewhere */
    RING = 64, EVERY = 4,  /* samples in the ring, ticks between them: the last 1.3 s; with less it forgets */
    TESTS = 4, TEST_STEPS = 10 /* of 25 ms */
};
#define TICK 0.005f         /* s */
#define FASTER 0.877058019f /* 1 / sqrt(1.3): unit of time under 1.3 times the gravity */

static const roln_loss loss = {.zdd = 1};
static const roln_opt rates = { /* only the Lagrangian network learns */
    .lr = {0, 0.001f, 0}, .beta1 = 0.9f, .beta2 = 0.99f, .eps = 1e-8f, .clip = 5};

/* All that a reset must not lose. */
typedef struct {
    uint32_t tick, samples; /* samples: since somebody last moved the chain */
    uint64_t seed;
    chain_params model;
    chain_optimiser optimiser;
    roln_real q[RING][N], qd[RING][N], qdd[RING][N]; /* ring */
    uint32_t filled;
    chain_state last[2]; /* samples of the last two ticks */
    chain_latent machine;
} memory;

static kept_mark marks[2] KEPT;
static memory copies[2] KEPT;

static chain_params machine; /* what nature knows */
static chain_gradient gradient;
static chain_train train;
static chain_work work;

/* Somewhere within the range of the training. */
static void move(chain_latent *s, uint64_t *seed)
{
    for (int i = 0; i < n; i++) {
        const roln_real low = chain_weights.z_min[i], high = chain_weights.z_max[i];
        s->z[i] = low + (high - low) * (0.15f + 0.7f * roln_uniform(seed));
        s->zd[i] = 0.3f * chain_weights.zd_max[i] * (2 * roln_uniform(seed) - 1);
    }
}

/* sqrt(sum |q_model - q|^2 / sum |q|^2) at the end of roll-outs that the learning has not seen. */
static float test(const chain_params *model)
{
    uint64_t seed = 99;
    roln_real error = 0, size = 0;
    for (int t = 0; t < TESTS; t++) {
        chain_latent a, b;
        chain_state x, y;
        roln_status st = ROLN_OK;
        move(&a, &seed);
        b = a;
        for (int k = 0; k < TEST_STEPS && st == ROLN_OK; k++) {
            st = chain_step(&machine, &a, NULL, 5 * TICK, &work);
            if (st == ROLN_OK) st = chain_step(model, &b, NULL, 5 * TICK, &work);
        }
        if (st != ROLN_OK || chain_decode(&machine, &a, &x, &work) != ROLN_OK || chain_decode(model, &b, &y, &work) != ROLN_OK)
            return -1;
        for (int i = 0; i < N; i++) {
            error += (y.q[i] - x.q[i]) * (y.q[i] - x.q[i]);
            size += x.q[i] * x.q[i];
        }
    }
    return ROLN_SQRT(error / size);
}

/* Every few ticks a sample into the ring: that of the tick before, with the central difference of qd. */
static void take(memory *m, const chain_state *x)
{
    if (m->samples++ >= 2 && m->samples % EVERY == 0) {
        const uint32_t r = m->filled++ % RING;
        memcpy(m->q[r], m->last[1].q, sizeof m->q[r]);
        memcpy(m->qd[r], m->last[1].qd, sizeof m->qd[r]);
        for (int i = 0; i < N; i++)
            m->qdd[r][i] = (x->qd[i] - m->last[0].qd[i]) / (2 * TICK);
    }
    m->last[0] = m->last[1];
    m->last[1] = *x;
}

static roln_status learn(memory *m)
{
    const int start = roln_randint((int)(m->filled < RING ? m->filled : RING), &m->seed);
    const roln_batch b = {.count = 1, .stride = 1, .start = &start, .q = m->q[0], .qd = m->qd[0], .qdd = m->qdd[0]};
    return chain_grad_acc(&m->model, &loss, &b, &gradient, &train);
}

/* One tick of the learner, x measured. Returns the copy to work on; *kind: 0 gradient, 1 update, 2 save. A sample or an update
   that fails leaves the model as it is. */
static int tick(int copy, const chain_state *x, int *kind)
{
    memory *m = &copies[copy];
    const uint32_t at = m->tick++ % TURN;
    *kind = at < BATCH ? 0 : at == BATCH ? 1 : 2;
    take(m, x);
    if (at == 0) memset(&gradient, 0, sizeof gradient);
    if (*kind == 0 && m->filled > 0) learn(m);
    if (*kind == 1 && gradient.windows > 0) chain_update(&m->model, &rates, &m->optimiser, &gradient, &train);
    return *kind == 2 ? kept_save(marks, copies, (int)sizeof *copies, copy) : copy;
}

/* Of numbers only: not of the padding between them. */
static uint64_t hash_of(const memory *m)
{
    uint64_t h = roln_fnv((int)sizeof m->model, (const unsigned char *)&m->model, ROLN_FNV);
    h = roln_fnv((int)sizeof m->optimiser.m, (const unsigned char *)m->optimiser.m, h);
    h = roln_fnv((int)sizeof m->optimiser.v, (const unsigned char *)m->optimiser.v, h);
    h = roln_fnv((int)sizeof m->q, (const unsigned char *)m->q, h);
    return roln_fnv((int)sizeof m->qdd, (const unsigned char *)m->qdd, h);
}

static void report(uint32_t at, const memory *m)
{
    put_text("tick ");
    put_integer(at, 5);
    put_text("  error");
    put_real(test(&m->model), 4);
    put_text("\n");
}

int main(void)
{
    static const char *const names[3] = {"\ninstructions of a tick: gradient ", ", update ", ", save "};
    uint32_t most[3] = {0, 0, 0};
    int copy = kept_open(marks, copies, (int)sizeof *copies);
    if (copy < 0) {
        copy = 0;
        memset(&copies[0], 0, sizeof copies[0]);
        copies[0].model = chain_weights;
        copies[0].seed = 1;
        put_text("start\n");
    } else {
        put_text("resumed at tick ");
        put_integer(copies[copy].tick, 0);
        put_text("\n");
    }
    machine = chain_weights;
    machine.scale.t *= FASTER;
    while (copies[copy].tick < TICKS) {
        memory *m = &copies[copy];
        chain_state x;
        int kind;
        if (m->tick % REPORT == 0) report(m->tick, m);
        if (m->tick % PUSH == 0) move(&m->machine, &m->seed), m->samples = 0;
        if (chain_step(&machine, &m->machine, NULL, TICK, &work) != ROLN_OK) return 1;
        if (chain_decode(&machine, &m->machine, &x, &work) != ROLN_OK) return 1; /* "read the encoders" */
        const uint32_t before = board_count();
        copy = tick(copy, &x, &kind);
        const uint32_t used = board_count() - before;
        if (used > most[kind]) most[kind] = used;
    }
    report(TICKS, &copies[copy]);
    put_text("hash ");
    put_hex(hash_of(&copies[copy]), 16);
    for (int i = 0; i < 3; i++) {
        put_text(names[i]);
        put_integer(most[i], 0);
    }
    put_text("\n");
    return 0;
}
