/* SPDX-License-Identifier: MIT */
/* measure.c - firmware.c at work: the stack that it really takes, by painting it, and the least and the most instructions of a tick
   over STATES random states in the range seen in training, with random references; and that a tick at the same z takes the same
   number, whatever zd and reference: all that differs is the eigensolver of M(z). Lines: what, number .. */

#include "text.h"
#include "firmware.h"

#define PAINT UINT32_C(0x5ca1ab1e)
#ifdef __arm__
#define MOVE "mov"
#else
#define MOVE "mv"
#endif

extern uint32_t stack_bottom[];
static uint64_t seed = 1;
static M(work) work;

static void must(roln_status st)
{
    if (st == ROLN_OK) return;
    put_text("a status other than ROLN_OK\n");
    board_exit(1);
}

static roln_real between(roln_real a, roln_real b)
{
    return a + (b - a) * roln_uniform(&seed);
}

static void draw(M(latent) *s)
{
    for (int i = 0; i < n; i++) {
        s->z[i] = between(weights->z_min[i], weights->z_max[i]);
        s->zd[i] = between(-weights->zd_max[i], weights->zd_max[i]);
    }
}

/* A state that is measured, at z if not NULL, and a reference. */
static void setup(const roln_real *z)
{
    M(latent) s, ref;
    draw(&s), draw(&ref);
    if (z) memcpy(s.z, z, sizeof s.z);
    must(M(decode)(weights, &s, &control.x, &work));
    for (int i = 0; i < n; i++) {
        control.ref.z[i] = ref.z[i], control.ref.zd[i] = ref.zd[i];
        control.ref.zdd[i] = between(-weights->zd_max[i], weights->zd_max[i]);
        control.ref.kp[i] = control.ref.kd[i] = 1;
    }
}

/* Bytes of the stack that f changes; f is called where sp stands here. */
__attribute__((noinline)) static uint32_t depth(roln_status (*f)(void))
{
    volatile uint32_t *p;
    uint32_t *sp;
    __asm volatile(MOVE " %0, sp" : "=r"(sp));
    for (p = stack_bottom; p < sp; p++)
        *p = PAINT;
    must(f());
    for (p = stack_bottom; p < sp && *p == PAINT; p++)
        ;
    return (uint32_t)(4 * (sp - p));
}

static void deepest(uint32_t *most, uint32_t bytes)
{
    if (bytes > *most) *most = bytes;
}

static void print(const char *what, uint32_t a, uint32_t b)
{
    put_text(what);
    put_integer(a, 10);
    put_integer(b, 10);
    put_text("\n");
}

static roln_status nothing(void)
{
    return ROLN_OK;
}

static uint32_t count(roln_status (*volatile f)(void))
{
    const uint32_t before = board_count();
    const roln_status st = f();
    const uint32_t used = board_count() - before;
    must(st);
    return used;
}

/* Stack first: the counter of emulator.c makes interrupts, which take some. */
int main(void)
{
    uint32_t stack[3] = {0, 0, 0};
#ifdef TRAIN
    enum { ROUNDS = 3 };
    learner.p = *weights;
#else
    enum { ROUNDS = 20 };
    uint32_t least = UINT32_MAX, most = 0;
#endif
    for (int k = 0; k < ROUNDS; k++) {
        setup(NULL);
        deepest(&stack[0], depth(tick));
        deepest(&stack[1], depth(ahead));
#ifdef TRAIN
        M(latent) s = control.s;
        M(state) x;
        for (int h = 0; h <= HORIZON; h++) {
            must(M(decode)(weights, &s, &x, &work));
            memcpy(learner.q + h * N, x.q, sizeof x.q), memcpy(learner.qd + h * N, x.qd, sizeof x.qd);
            must(M(step)(weights, &s, NULL, weights->dt, &work));
        }
        for (int i = 0; i < N; i++)
            learner.qdd[i] = (learner.qd[N + i] - learner.qd[i]) / weights->dt;
        deepest(&stack[2], depth(train));
#endif
    }
    print("tick", stack[0], 0), print("ahead", stack[1], 0), print("train", stack[2], 0);
#ifndef TRAIN
    for (int k = 0; k < STATES; k++) {
        setup(NULL);
        const uint32_t empty = count(nothing), used = count(tick) - empty;
        least = used < least ? used : least, most = used > most ? used : most;
    }
    print("instructions", least, most);
    M(latent) s;
    uint32_t same = 0;
    draw(&s);
    for (int k = 0; k < 20; k++) {
        setup(s.z);
        const uint32_t used = count(tick);
        if (k > 0 && used != same) put_text("the same z, another count\n"), board_exit(1);
        same = used;
    }
#endif
    return 0;
}
