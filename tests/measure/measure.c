/* SPDX-License-Identifier: MIT */
/* measure.c - firmware.c at work: the stack that it really takes, by painting it, and the least and the most instructions of a tick
   over STATES random states in the range seen in training, with random references; and that a tick at the same z takes the same
   number, whatever zd and reference: all that differs is the eigensolver of M(z). Lines: what, number .. */

#include "text.h"
#include "states.h"

#define PAINT UINT32_C(0x5ca1ab1e)
#ifdef __arm__
#define MOVE "mov"
#else
#define MOVE "mv"
#endif

extern uint32_t stack_bottom[];

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

/* Stack first: the counter of emulator.c makes interrupts, which take some. */
int main(void)
{
    uint32_t stack[3] = {0, 0, 0};
#ifdef TRAIN
    learner.p = *weights;
#endif
#ifdef MORE
    enum { ROUNDS = 3 };
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
            must(M(decode)(weights, &s, &x, &work.decode));
            memcpy(learner.q + h * N, x.q, sizeof x.q), memcpy(learner.qd + h * N, x.qd, sizeof x.qd);
            must(M(step)(weights, &s, NULL, weights->dt, &work.step));
        }
        for (int i = 0; i < N; i++)
            learner.qdd[i] = (learner.qd[N + i] - learner.qd[i]) / weights->dt;
#endif
#ifdef MORE
        deepest(&stack[2], depth(MORE));
#endif
    }
    print("tick", stack[0], 0), print("ahead", stack[1], 0);
#ifdef MORE
    print(STRING(MORE), stack[2], 0);
#else
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
