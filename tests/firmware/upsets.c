/* SPDX-License-Identifier: MIT */
/* upsets.c - single-event upsets: a controller in closed loop, and in every run one bit that flips, somewhere, at some instruction.

   The controller is that of control.c, a tick of the chain's model under the guard, with its weights in RAM; the machine is that of
   rods.h, which lies apart, as all of this file does, and is no target. A timer interrupt stops a tick at a random instruction,
   flips a random bit and lets it go on: in the weights, the settings (limits, reference, gains), the constants (the descriptor of
   the model), the state (measurement, z, guard, sums), the scratch, the live stack, the registers but sp, or the code. The 32 ticks
   from then on are compared with those of the undisturbed run; fewer if the guard has found it, if nothing is left of it, or if the
   checks have found it and eight torques were as ever. A processor fault, or a tick that takes more than twice the time it should,
   resets the chip, which goes on with the next run. Each run prints a line, by which tests/firmware/upsets.sh counts.

   In every tick the checks run, too, and say what they find, but nobody acts on it, so that one run shows both what the guard
   finds by itself and what both find: NAME_check of the weights; the same sum of settings, constants and code; NAME_in_range; are
   the torques that the guard holds those that the motors have; did the tick come to its end.

   Cortex-M or RV32, with -Wl,--wrap=systick; RV32 in QEMU with -icount shift=7, so that an instruction takes 128 ns and its timer,
   10 MHz, can stop at any. Input: a line `first last seed`. Output, with ticks counted from that of the upset, - for never:
   u run region words end ticks guard-tick faults check-tick checks away-tick differs largest-torque beyond-limit caller-damaged */

#define ROLN_CODE __attribute__((section("target"))) /* all of the library's code; the linker says where it lies */
#include "rods.h"
#include "chain_weights.h"
#include "text.h"

enum {
    N = chain_N, n = chain_n,
    START = 24, WINDOW = 32, TICKS = START + WINDOW, /* upsets in one of the first START ticks; ticks that follow */
    OF_WEIGHTS = 64, OF_CODE = 512,                  /* numbers that a tick sums: a pass is over in 13 ticks, in 11 */
    ALL = 1 << 20
};
#define TICK 0.005f    /* s */
#define SPEED 8.0f     /* 1/s, of the closed loop */
#define JOULE 19.8328f /* 1 Nm in the unit of the model */
#define AWAY 0.014f    /* rad, 1 % of the range of the free joints: nearer to the undisturbed run is harmless */

static const float mass[N] = {0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f, 0.1f};
extern uint32_t __start_target[], __stop_target[];

/* What a reset must not lose, the run that is under way, in another memory: a program that writes on and on does not reach it. */
#ifdef __arm__
#define APART 0x21ff0000 /* PSRAM of the board */
#else
#define APART 0x87ff0000 /* 127 MB behind what is used */
#endif
static struct {
    uint32_t magic, run, last, active, region, words, tick, ticks, differs, beyond, astray;
    uint64_t seed;
    float limit[N], rate[N], first[N]; /* limits of each joint, 0: not known yet; torque of the first tick */
    int guard_at, check_at, away_at;
    uint32_t guard_said, check_said;
    float largest;
} *const run = (void *)APART;
enum { MAGIC = 0x5e07a110 };

/* ---- the controller ---- */

static struct {
    rods machine;
    float motor[N]; /* torques in force, in the unit of the model */
} plant;

enum { WEIGHTS, SETTINGS, CONSTANTS, CODE, SUMS, RANGE = SUMS, HELD, UNENDED }; /* bits of what checks say */

static struct {
    chain_params weights;
    struct {
        roln_limits limits;
        float most[N], rate[N]; /* of limits */
        chain_target target;
    } settings;
    struct {
        chain_state x;
        chain_latent s;
        chain_guard guard; /* guard.tau: to the motors */
        roln_check sum[SUMS];
    } state;
    chain_work work;
} ctl;
static volatile uint32_t said[2]; /* faults, checks */
#ifndef ONE_LIMIT
#define ONE_LIMIT 0 /* 1: a guard that has but one limit of torque for all joints, none of rate */
#endif

#define CODE_BYTES ((size_t)(__stop_target - __start_target) * 4)
ROLN_CODE static uint32_t sum_step(const void *p, size_t bytes, int count, int which)
{
    return (uint32_t)(roln_check_step((int)(bytes / 4), p, count, &ctl.state.sum[which]) != ROLN_OK) << which;
}

ROLN_CODE static uint32_t sums(int of_weights, int of_code)
{
    return (uint32_t)(chain_check(&ctl.weights, of_weights, &ctl.state.sum[WEIGHTS]) != ROLN_OK) << WEIGHTS |
           sum_step(&ctl.settings, sizeof ctl.settings, ALL, SETTINGS) |
           sum_step(&chain_model, sizeof chain_model, ALL, CONSTANTS) | sum_step(__start_target, CODE_BYTES, of_code, CODE);
}

/* What a timer interrupt calls. */
ROLN_CODE static __attribute__((noinline, used)) void controller(void)
{
    const uint32_t bad = sums(OF_WEIGHTS, OF_CODE) |
                         (uint32_t)(memcmp(ctl.state.guard.tau, plant.motor, sizeof plant.motor) != 0) << HELD;
    said[0] = chain_tick(&ctl.weights, &ctl.settings.limits, &ctl.state.x, &ctl.settings.target, &ctl.state.s, &ctl.state.guard,
                         &ctl.work.tick);
    said[1] = bad | (uint32_t)!chain_in_range(&ctl.weights, &ctl.state.s) << RANGE;
}

/* Start at rest, hanging, and hold a pose, with gains SPEED^2 and 2 SPEED times the diagonal of M there; sums as they should be. */
static int controller_start(void)
{
    static const roln_limits limits = {
        .dt = TICK, .margin = 0.1f, .residual = 4 * JOULE, .tau = 4.6f * JOULE, .hold = 5, .q_tolerance = 0.05f, .qd_tolerance = 1};
    static const float rest[N];
    chain_state pose;
    chain_latent at = {{0}, {0}};
    chain_equation e;
    roln_status st;
    memset(&ctl, 0, sizeof ctl);
    ctl.weights = chain_weights;
    ctl.settings.limits = limits;
    memcpy(ctl.state.guard.tau, run->first, sizeof run->first);
    if (run->limit[0] > 0 && !ONE_LIMIT) {
        memcpy(ctl.settings.most, run->limit, sizeof run->limit);
        memcpy(ctl.settings.rate, run->rate, sizeof run->rate);
        ctl.settings.limits.tau_each = ctl.settings.most;
        ctl.settings.limits.rate_each = ctl.settings.rate;
    }
    for (int i = 0; i < n; i++)
        at.z[i] = 0.25f * chain_weights.z_min[i] + 0.75f * chain_weights.z_max[i];
    st = chain_decode(&ctl.weights, &at, &pose, &ctl.work.decode);
    if (st == ROLN_OK)
        st = chain_encode_reference(&ctl.weights, pose.q, rest, rest, &ctl.settings.target, &ctl.work.encode_reference);
    if (st == ROLN_OK) st = chain_dynamics(&ctl.weights, &at, &e, &ctl.work.dynamics);
    for (int i = 0; i < n && st == ROLN_OK; i++) {
        ctl.settings.target.kp[i] = SPEED * SPEED * e.M[i * (n + 1)];
        ctl.settings.target.kd[i] = 2 * SPEED * e.M[i * (n + 1)];
    }
    return st == ROLN_OK && sums(ALL, ALL) == 0;
}

/* ---- the upset ---- */

enum { IN_WEIGHTS, IN_SETTINGS, IN_CONSTANTS, IN_STATE, IN_WORK, IN_STACK, IN_REGISTERS, IN_CODE, REGIONS };

static volatile enum { OFF, UPSET, LIMIT } phase; /* of the timer */
enum { LONG = 1600000, TOO_LONG = 100000 };       /* instructions: that nothing takes, more than twice those of a tick */
static uint32_t nothing, *flipped, flipped_bit, passed;
static uint32_t *stack_base __attribute__((used)), before[26] __attribute__((used)), after[26] __attribute__((used));
static uint64_t random_state;

static uint32_t random_below(uint32_t most)
{
    uint64_t x = random_state += UINT64_C(0x9e3779b97f4a7c15); /* splitmix64 */
    x = (x ^ x >> 30) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ x >> 27) * UINT64_C(0x94d049bb133111eb);
    return (uint32_t)((x >> 32) * most >> 32);
}

static void print(char end);
static void again(char end) __attribute__((noreturn));

/* A run that has ended the program: say so, and begin the next one with everything in memory new. */
static void again(char end)
{
    run->guard_at = (int)run->tick;
    print(end);
    run->active = 0, run->run++;
    board_reset();
    for (;;)
        ;
}

/* A fault of the processor ends here first (board.h). */
void board_safe(void)
{
    if (run->magic == MAGIC && run->active) again('f');
}

static void timer(uint32_t instructions);
static void flash_writable(int yes);

static void flip(void)
{
    flash_writable(1);
    *(volatile uint32_t *)flipped ^= flipped_bit;
    flash_writable(0);
}

/* The timer: `count` registers as the interrupt has saved them; what is live of the stack, upwards. */
static void interrupted(uint32_t *registers, uint32_t count, uint32_t *live)
{
    uint32_t words, *at, region = run->region;
    if (phase != UPSET) again('t');
    if (region == IN_STACK && live >= stack_base) region = IN_REGISTERS; /* in front of the first instruction, or behind the last */
    switch (region) {
    case IN_WEIGHTS: at = (uint32_t *)&ctl.weights, words = sizeof ctl.weights / 4; break;
    case IN_SETTINGS: at = (uint32_t *)&ctl.settings, words = sizeof ctl.settings / 4; break;
    case IN_CONSTANTS: at = (uint32_t *)(uintptr_t)&chain_model, words = sizeof chain_model / 4; break;
    case IN_STATE: at = (uint32_t *)&ctl.state, words = sizeof ctl.state / 4; break;
    case IN_WORK: at = (uint32_t *)&ctl.work, words = sizeof ctl.work / 4; break;
    case IN_STACK: at = live, words = (uint32_t)(stack_base - live); break;
    case IN_CODE: at = __start_target, words = CODE_BYTES / 4; break;
    default: at = registers, words = count; break;
    }
    run->words = words;
    flipped = at + random_below(words), flipped_bit = 1u << random_below(32);
    flip();
    phase = LIMIT;
    timer(TOO_LONG);
}

#ifdef __arm__

#define REGISTER(address) (*(volatile uint32_t *)(address))
enum { ZEROED = 8 };

/* From now on, one that takes 256 ns: 6.4 ticks. 0: never */
static void timer(uint32_t instructions)
{
    REGISTER(0xe000e010) = 0;
    REGISTER(0xe000e014) = instructions * 32 / 5;
    REGISTER(0xe000e018) = 0;
    if (instructions > 0) REGISTER(0xe000e010) = 7;
}

void __wrap_systick(void);
void timer_interrupt(uint32_t *saved, uint32_t lr);

/* On the stack, upwards: s16-s31, r4-r11; r0-r3, r12, lr, pc, xpsr; if floating point was in use s0-s15, fpscr, nothing. */
__attribute__((naked)) void __wrap_systick(void)
{
    __asm volatile("push {r4-r11}\n vpush {s16-s31}\n mov r0, sp\n mov r1, lr\n push {r3, lr}\n bl timer_interrupt\n"
                   "pop {r3, lr}\n vpop {s16-s31}\n pop {r4-r11}\n bx lr");
}

__attribute__((used)) void timer_interrupt(uint32_t *saved, uint32_t lr)
{
    const uint32_t frame = lr & 16 ? 8 : 26, gap = saved[24 + 7] >> 9 & 1;
    interrupted(saved, 24 + (frame == 8 ? 8 : 25), saved + 24 + frame + gap);
}

/* What is flash on a board is memory here: the protection unit lets no program write there, or run in RAM. */
static void flash_writable(int yes)
{
    static const uint32_t only_read = 6u << 24, never_run = 1u << 28 | 3u << 24;
    REGISTER(0xe000ed94) = 0;
    if (yes) return;
    REGISTER(0xe000ed9c) = 1 << 4 | 0, REGISTER(0xe000eda0) = only_read | 28 << 1 | 1;        /* 0, 512 MB */
    REGISTER(0xe000ed9c) = 0x20000000 | 1 << 4 | 1, REGISTER(0xe000eda0) = never_run | 28 << 1 | 1; /* 512 MB */
    REGISTER(0xe000ed94) = 5; /* on; elsewhere as without it */
    __asm volatile("dsb\n isb" ::: "memory");
}

static void timer_start(void)
{
    timer(0);
    flash_writable(0);
}

/* Rounding and the like. */
static uint32_t float_mode(void)
{
    uint32_t x;
    __asm volatile("vmrs %0, fpscr" : "=r"(x));
    return x & 0x07c00000;
}

static void float_mode_reset(void)
{
    __asm volatile("vmsr fpscr, %0" ::"r"(0));
}

static uint32_t timer_passed(void)
{
    return (REGISTER(0xe000e014) - REGISTER(0xe000e018)) * 5 / 32;
}

/* r4-r11, s16-s31, sp are kept apart; the controller sees none of what this file has in them. */
__attribute__((naked, noinline)) static void call(void)
{
    __asm volatile("push {r3-r11, lr}\n ldr r0, =before\n stmia r0!, {r4-r11}\n vstmia r0!, {s16-s31}\n mov r1, sp\n str r1, [r0]\n"
                   "ldr r0, =stack_base\n str r1, [r0]\n"
                   ".irp i,4,5,6,7,8,9,10,11\n mov r\\i, #0\n .endr\n bl controller\n"
                   "ldr r0, =after\n stmia r0!, {r4-r11}\n vstmia r0!, {s16-s31}\n mov r1, sp\n str r1, [r0]\n"
                   "ldr r0, =before\n ldmia r0!, {r4-r11}\n vldmia r0!, {s16-s31}\n ldr r1, [r0]\n mov sp, r1\n pop {r3-r11, pc}");
}

#else

enum { ZEROED = 12 };
static uint32_t timer_from;
static volatile uint32_t *const mtime = (volatile uint32_t *)0x0200bff8, *const mtimecmp = (volatile uint32_t *)0x02004000;
extern void trap(void);
void timer_interrupt(void);

/* 128 ns each, 1.28 ticks. */
static void timer(uint32_t instructions)
{
    mtimecmp[1] = 0xffffffff;
    if (instructions == 0) return;
    const uint32_t high = mtime[1], low = mtime[0], then = low + instructions * 32 / 25;
    timer_from = low;
    mtimecmp[0] = then;
    mtimecmp[1] = high + (then < low); /* in 7 minutes high changes, between the two reads hardly ever */
}

/* x1, x3 .. x31, f0 .. f31, pc, fcsr; mscratch points here, and holds sp meanwhile. */
static uint32_t saved[30 + 32 + 2] __attribute__((used)), handler_stack[512] __attribute__((used, aligned(16)));

#define EVERY(x, f) \
    x " x1, 0(sp)\n .irp i,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23,24,25,26,27,28,29,30,31\n" \
    x " x\\i, 4*(\\i-2)(sp)\n .endr\n" \
    ".irp i,0,1,2,3,4,5,6,7,8,9,10,11,12,13,14,15,16,17,18,19,20,21,22,23,24,25,26,27,28,29,30,31\n" \
    f " f\\i, 4*(\\i+30)(sp)\n .endr\n"
__attribute__((naked, used, aligned(4))) static void interrupt(void)
{
    __asm volatile("csrrw sp, mscratch, sp\n" EVERY("sw", "fsw")
                   "csrr t0, mepc\n sw t0, 4*62(sp)\n csrr t0, fcsr\n sw t0, 4*63(sp)\n"
                   ".option push\n .option norelax\n la gp, __global_pointer$\n la sp, handler_stack+2048\n .option pop\n"
                   "csrr t0, mcause\n bltz t0, 1f\n j trap\n"
                   "1: call timer_interrupt\n"
                   "la sp, saved\n lw t0, 4*62(sp)\n csrw mepc, t0\n lw t0, 4*63(sp)\n csrw fcsr, t0\n" EVERY("lw", "flw")
                   "csrrw sp, mscratch, sp\n mret");
}

__attribute__((used)) void timer_interrupt(void)
{
    uint32_t *live;
    __asm volatile("csrr %0, mscratch" : "=r"(live));
    interrupted(saved, sizeof saved / 4, live);
}

/* Until the next reset: no writing to the code of this file, in whole pages; nothing between RAM and APART. */
static void flash_writable(int yes)
{
    (void)yes;
    __asm volatile("csrw pmpaddr0, %0\n csrw pmpaddr1, %1\n csrw pmpaddr2, %2\n csrw pmpaddr3, %3\n csrw pmpcfg0, %4" ::"r"(
                       0x80000000 >> 2),
                   "r"((uintptr_t)&chain_model >> 12 << 10), "r"(0x80180000 >> 2), "r"(APART >> 2), "r"(0x88008d00));
}

static void timer_start(void)
{
    timer(0);
    flash_writable(0);
    __asm volatile("csrw mscratch, %0\n csrw mtvec, %1\n csrs mie, %2\n csrs mstatus, %3" ::"r"(saved), "r"(interrupt),
                   "r"(1 << 7), "r"(1 << 3));
}

static uint32_t float_mode(void)
{
    uint32_t x;
    __asm volatile("csrr %0, frm" : "=r"(x));
    return x;
}

static void float_mode_reset(void)
{
    __asm volatile("csrw fcsr, zero");
}

static uint32_t timer_passed(void)
{
    return (mtime[0] - timer_from) * 25 / 32;
}

/* s0-s11, fs0-fs11, sp, gp are kept apart; the controller sees none of what this file has in them. */
#define SAVED(x, f) \
    ".irp i,0,1,2,3,4,5,6,7,8,9,10,11\n" x " s\\i, 4*\\i(t0)\n" f " fs\\i, 4*(\\i+12)(t0)\n .endr\n" \
    x " sp, 4*24(t0)\n" x " gp, 4*25(t0)\n"
__attribute__((naked, noinline)) static void call(void)
{
    __asm volatile(".option push\n .option norelax\n addi sp, sp, -16\n sw ra, 12(sp)\n lla t0, before\n" SAVED("sw", "fsw")
                   "lla t0, stack_base\n sw sp, 0(t0)\n"
                   ".irp i,0,1,2,3,4,5,6,7,8,9,10,11\n li s\\i, 0\n .endr\n call controller\n"
                   "lla t0, after\n" SAVED("sw", "fsw") "lla t0, before\n" SAVED("lw", "flw")
                   "lw ra, 12(sp)\n addi sp, sp, 16\n ret\n .option pop");
}

#endif

/* ---- the machine, and the run without an upset ---- */

static unsigned char settings[sizeof ctl.settings];
static struct {
    unsigned char state[sizeof ctl.state]; /* before the tick */
    rods machine;
    float motor[N]; /* after it */
    uint32_t instructions;
} reference[TICKS + 1];
static uint32_t whole;

static __attribute__((noinline)) void tick(uint32_t instructions)
{
    rods_read(&plant.machine, &ctl.state.x);
    said[0] = 0, said[1] = 1 << UNENDED;
    timer(instructions);
    call();
    passed = timer_passed();
    timer(0);
    memcpy(plant.motor, ctl.state.guard.tau, sizeof plant.motor);
}

static void machine_step(void)
{
    float tau[N];
    for (int i = 0; i < N; i++)
        tau[i] = plant.motor[i] / JOULE;
    rods_step(&plant.machine, mass, tau, TICK);
}

static uint32_t mix(uint32_t sum, const void *p, size_t bytes)
{
    const uint32_t *w = p;
    for (size_t i = 0; i < bytes / 4; i++)
        sum = (sum ^ w[i]) * 16777619;
    return sum;
}

/* Over all that no run changes. */
static uint32_t memory_sum(void)
{
    uint32_t sum = mix(1, __start_target, CODE_BYTES);
    sum = mix(sum, &chain_model, sizeof chain_model);
    sum = mix(sum, &chain_weights, sizeof chain_weights);
    sum = mix(sum, settings, sizeof settings);
    return mix(sum, reference, sizeof reference);
}

/* The motion without an upset: 0 if something is reported on the way. */
static int undisturbed(void)
{
    const rods hanging = {{0, 0}, {0, 0}};
    memcpy(plant.motor, ctl.state.guard.tau, sizeof plant.motor);
    plant.machine = hanging;
    memcpy(settings, &ctl.settings, sizeof settings);
    for (int k = 0; k <= TICKS; k++) {
        memcpy(reference[k].state, &ctl.state, sizeof ctl.state);
        reference[k].machine = plant.machine;
        tick(LONG);
        reference[k].instructions = passed;
        memcpy(reference[k].motor, plant.motor, sizeof plant.motor);
        if (said[0] || said[1]) return 0;
        machine_step();
    }
    whole = memory_sum();
    return 1;
}

/* ---- runs ---- */

static void put_at(int at)
{
    if (at < 0) put_text(" -");
    else put_integer((uint32_t)at, 3);
}

static void print(char end)
{
    const char what[] = {' ', end, 0};
    put_text("u ");
    put_integer(run->run, 0);
    put_integer(run->region, 2);
    put_integer(run->words, 5);
    put_text(what);
    put_integer(run->ticks, 3);
    put_at(run->guard_at);
    put_text(" ");
    put_integer(run->guard_said, 3);
    put_at(run->check_at);
    put_text(" ");
    put_integer(run->check_said, 2);
    put_at(run->away_at);
    put_integer(run->differs, 2);
    put_real(run->largest, 3);
    put_integer(run->beyond, 2);
    put_integer(run->astray, 2);
    put_text("\n");
}

/* What came out of a tick. */
static void judge(int k)
{
    if (said[1] && run->check_at < 0) run->check_at = (int)run->tick, run->check_said = said[1];
    if (said[0] & ~(uint32_t)ROLN_CLIPPED) {
        run->guard_at = (int)run->tick, run->guard_said = said[0];
        return;
    }
    for (unsigned i = 0; i < sizeof after / sizeof *after; i++)
        run->astray |= after[i] != (i < ZEROED ? 0 : before[i]);
    run->differs |= memcmp(plant.motor, reference[k].motor, sizeof plant.motor) != 0;
    for (int i = 0; i < N; i++) {
        const float size = plant.motor[i] < 0 ? -plant.motor[i] : plant.motor[i];
        if (!(size <= run->limit[i])) run->beyond = 1;
        if (size / run->limit[i] > run->largest) run->largest = size / run->limit[i];
    }
    machine_step();
    for (int i = 0; i < n; i++) {
        const float d = plant.machine.z[i] - reference[k + 1].machine.z[i];
        if (!(d <= AWAY && d >= -AWAY) && run->away_at < 0) run->away_at = (int)run->tick;
    }
}

/* Nothing is left of the upset. */
static int over(int k)
{
    return float_mode() == 0 && memcmp(&ctl.state, reference[k + 1].state, sizeof ctl.state) == 0 &&
           memcmp(&plant.machine, &reference[k + 1].machine, sizeof plant.machine) == 0 &&
           memcmp(&ctl.settings, settings, sizeof settings) == 0 &&
           memcmp(&ctl.weights, &chain_weights, sizeof chain_weights) == 0 && memory_sum() == whole;
}

static void one(void)
{
    const int start = (int)random_below(START);
    const uint32_t instant = 20 + random_below(reference[start].instructions - 40);
    int ended = 0;
    flipped = &nothing;
    ctl.weights = chain_weights;
    memcpy(&ctl.settings, settings, sizeof settings);
    memcpy(&ctl.state, reference[start].state, sizeof ctl.state);
    memset(&ctl.work, 0, sizeof ctl.work);
    memcpy(plant.motor, ctl.state.guard.tau, sizeof plant.motor);
    plant.machine = reference[start].machine;
    float_mode_reset();
    for (int k = start; k < start + WINDOW && run->guard_at < 0 && !ended; k++) {
        run->tick = (uint32_t)(k - start);
        phase = k == start ? UPSET : LIMIT;
        tick(k == start ? instant : TOO_LONG);
        if (phase == UPSET) print('?'); /* the timer has failed */
        phase = OFF;
        judge(k);
        run->ticks++;
        ended = run->guard_at < 0 && (over(k) || (run->check_at >= 0 && !run->differs && run->ticks >= 8));
    }
    if (run->region == IN_CODE || run->region == IN_CONSTANTS) flip(); /* back */
    print('.');
}

/* Limits, at power-up: 1.5 times the largest torque of each joint, and twice its largest change, of a motion that has nothing but
   one limit for all joints. Motions start under their first torque. */
static int limits_find(void)
{
    if (!controller_start() || !undisturbed()) return 0;
    memcpy(run->first, reference[0].motor, sizeof run->first);
    for (int i = 0; i < N; i++) {
        float most = 0, rate = 0;
        for (int k = 0; k <= TICKS; k++) {
            const float tau = reference[k].motor[i], change = tau - reference[k > 0 ? k - 1 : 0].motor[i];
            most = ROLN_MAX(most, ROLN_ABS(tau));
            rate = ROLN_MAX(rate, ROLN_ABS(change) / TICK);
        }
        run->limit[i] = 1.5f * most;
        run->rate[i] = 2 * rate;
    }
    return 1;
}

static uint32_t number(void)
{
    uint32_t x = 0, c;
    while ((c = board_get()) >= '0' && c <= '9')
        x = 10 * x + c - '0';
    return x;
}

static void power_up(void)
{
    memset(run, 0, sizeof *run);
    put_text("up\n");
    run->run = number(), run->last = number(), run->seed = number();
    run->magic = MAGIC;
    put_text("bytes");
    put_integer(sizeof ctl.weights, 8);
    put_integer(sizeof ctl.settings, 8);
    put_integer(sizeof chain_model, 8);
    put_integer(sizeof ctl.state, 8);
    put_integer(sizeof ctl.work, 8);
    put_integer(CODE_BYTES, 8);
    put_text("\n");
}

int main(void)
{
    if (run->magic != MAGIC) power_up();
    else if (run->active) again('r'); /* a reset that nobody asked for, perhaps a jump to it */
    timer_start();
    if ((!(run->limit[0] > 0) && !limits_find()) || !controller_start() || !undisturbed()) {
        put_text("the undisturbed motion is not good: faults ");
        put_integer(said[0], 0);
        put_text(", checks ");
        put_integer(said[1], 0);
        put_text("\n");
        return 1;
    }
    for (; run->run <= run->last; run->run++) {
        random_state = (run->seed << 32) + run->run;
        run->region = run->run % REGIONS;
        run->tick = run->ticks = run->words = run->astray = run->differs = run->beyond = run->guard_said = run->check_said = 0;
        run->guard_at = run->check_at = run->away_at = -1;
        run->largest = 0;
        run->active = 1;
        one();
        run->active = 0;
        if (memory_sum() != whole) run->run++, board_reset(); /* a stray write: everything anew */
    }
    put_text("end\n");
    run->magic = 0;
    return 0;
}
