/* SPDX-License-Identifier: MIT */
/* interrupts.c - a control tick in the midst of other calls, as of a timer interrupt: at every instruction of them, where a
   processor can be stepped (x86-64 and Linux: the trap flag), and at random instants of a timer. The tick has scratch of its own:
   its results and those of what it interrupts have the bits that they have alone. tests/unit/test_safety.c
   asks the same at fences. */
#define _GNU_SOURCE
#include <signal.h>
#include <sys/time.h>
#include <ucontext.h>
#include "threads.h"
#include "unit/check.h"

/* What interrupts: its own state, results that it is to have, and how often it came. */
static struct {
    scratch own;
    arm_state x;
    arm_target r;
    arm_latent s, want_s;
    arm_guard want;
    volatile long count, wrong;
    volatile sig_atomic_t stop;
} tick;

static void interrupt(void)
{
    arm_latent s = tick.s;
    arm_guard g;
    uint32_t faults;
    memset(&g, 0, sizeof g);
    tick.count++;
    faults = arm_tick(&p, &limits, &tick.x, &tick.r, &s, &g, &tick.own.work.tick);
    tick.wrong += faults != 0 || memcmp(&s, &tick.want_s, sizeof s) != 0 || memcmp(&g, &tick.want, sizeof g) != 0;
}

static void begin_tick(void)
{
    results o;
    begin(99, &o);
    if (arm_decode(&p, &o.s, &tick.x, &tick.own.work.decode) != ROLN_OK) return;
    tick.r = o.r, tick.s = o.s, tick.want_s = o.s;
    CHECK(arm_tick(&p, &limits, &tick.x, &tick.r, &tick.want_s, &tick.want, &tick.own.work.tick) == 0);
    CHECK(tick.want.tau[0] > 0 || tick.want.tau[0] < 0);
}

#if defined __x86_64__ && defined __linux__
#define STEPPED 1
/* Behind every instruction, until stop. */
static void trap(int number, siginfo_t *info, void *of)
{
    ucontext_t *context = of;
    (void)number, (void)info;
    if (tick.stop) context->uc_mcontext.gregs[REG_EFL] &= ~0x100LL;
    else context->uc_mcontext.gregs[REG_EFL] |= 0x100, interrupt();
}

/* Call k of what is interrupted, with a tick behind each instruction. */
static void step_through(int k, results *o, scratch *w)
{
    tick.stop = 0;
    raise(SIGTRAP);
    call(k, o, w);
    tick.stop = 1;
    raise(SIGTRAP);
}
#else
#define STEPPED 0
#endif

static void alarm_rings(int number)
{
    (void)number;
    if (!tick.stop) interrupt();
}

static void catch_signals(void)
{
    struct sigaction a;
    memset(&a, 0, sizeof a);
    a.sa_handler = alarm_rings, a.sa_flags = SA_RESTART;
    CHECK(sigaction(SIGALRM, &a, NULL) == 0);
#if STEPPED
    a.sa_sigaction = trap, a.sa_flags = SA_SIGINFO;
    CHECK(sigaction(SIGTRAP, &a, NULL) == 0);
#endif
}

/* Calls, alone and interrupted: all of them as long as the timer has not rung `rings` times; those before LINEAR, which are not so
   long that stepping takes minutes, by instructions. */
static void test_calls(int stepped, long rings)
{
    static scratch w;
    static results o, want;
    const struct itimerval off = {{0, 0}, {0, 0}}, often = {{0, 97}, {0, 97}};
    long calls = 0;
    int k, wrong = 0;
    tick.count = tick.wrong = 0;
    begin(7, &want), begin(7, &o);
    tick.stop = 1;
    setitimer(ITIMER_REAL, stepped ? &off : &often, NULL);
    for (k = 0; (stepped && k < LINEAR) || (!stepped && tick.count < rings); k = stepped ? k + 1 : (k + 1) % CALLS, calls++) {
        call(k, &want, &w);
        tick.stop = 0;
#if STEPPED
        if (stepped) step_through(k, &o, &w);
#endif
        if (!stepped) call(k, &o, &w);
        tick.stop = 1;
        wrong += memcmp(&o, &want, sizeof o) != 0;
        if (calls % 1000 == 999) begin((uint64_t)calls, &want), begin((uint64_t)calls, &o); /* a motion goes on for a while */
    }
    setitimer(ITIMER_REAL, &off, NULL);
    CHECK(wrong == 0 && tick.wrong == 0 && want.statuses == 0);
    CHECK(tick.count > (stepped ? 10000 : rings - 1));
    printf("%s: %ld ticks in %ld calls\n", stepped ? "at every instruction" : "at random instants", tick.count, calls);
}

int main(void)
{
    make_model();
    begin_tick();
    catch_signals();
    test_calls(0, 3000);
    CHECK(STEPPED);
    if (STEPPED) test_calls(1, 0);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
