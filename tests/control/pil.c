/* SPDX-License-Identifier: MIT */
/* pil - processor in the loop: MuJoCo's chain here, its controller an image in QEMU (examples/firmware/serial.c), between them the
   emulated serial line, in lock step.
     pil CORE ..        from the top of the repository, after `make firmware`
     pil test CORE ..   a part of the ticks, which is the step of make release

   The loop gives the same states and torques as the one on this machine alone, bit for bit; so does a loop whose line loses,
   repeats and damages frames, with what the guard makes of it. Then one fault after the other. */
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#include "examples/firmware/frame.h"
#include "../unit/check.h"
#include "control.h"
#include "image.h"

enum {
    N = 16, n = 4, NUMBERS = 2 * N + 3 * n, SIZE = FRAME_SIZE(N, n), ANSWER = FRAME_ANSWER(N),
    TICKS = 10000,  /* of the loop; of the one on a bad line a tenth */
    PART = 2500,    /* in the test */
    LIMIT = 1800     /* s for everything */
};
#define BAD (ROLN_FAULT_STATUS | LINK_NONE)       /* what the answer of a tick without a frame says */
#define OFF (BAD | ROLN_FAULT_EXPIRED)

/* ---- the image ---- */

struct image {
    struct image_line line;
    uint32_t number;            /* of the last frame sent */
    struct control_model *model;
    const struct loop *want;    /* what the loop on this machine did */
    int tick, lossy, different; /* ticks whose state or torque has other bits, or that tell of faults */
    double used;                /* instructions of all ticks */
};

struct answer {
    uint32_t number, faults, all, used;
    float tau[N];
};

static int get(const struct image *m, struct answer *a)
{
    uint8_t bytes[ANSWER];
    if (image_get(&m->line, ANSWER, bytes)) {
        printf("no answer to frame %u\n", (unsigned)m->number);
        return -1;
    }
    a->number = frame_get(bytes, 1);
    a->faults = frame_get(bytes, 2);
    a->all = frame_get(bytes, 3);
    a->used = frame_get(bytes, 4);
    frame_get_floats(bytes, 5, N, a->tau);
    if (memcmp(bytes, FRAME_START "t", 4) == 0 && frame_whole(ANSWER, bytes)) return 0;
    printf("what came is no answer\n");
    return -1;
}

/* Starts the image, which says that it is up. */
static int image_open(struct image *m, const char *core)
{
    struct answer up;
    memset(m, 0, sizeof *m);
    if (image_start(&m->line, core, "serial")) return -1;
    if (!get(m, &up) && !up.number && !up.all) return 0;
    image_stop(&m->line);
    return -1;
}

/* Frame of a tick: x [N + N + 3 n]; of arming: gains. */
static void make_tick(uint8_t frame[SIZE], uint32_t number, const float *x)
{
    memcpy(frame, FRAME_START "t", 4);
    frame_put(frame, 1, number);
    frame_put_floats(frame, 2, NUMBERS, x);
    frame_seal(SIZE, frame);
}

static void make_arm(uint8_t frame[SIZE], uint32_t number, const struct control_gains *g)
{
    memset(frame, 0, SIZE);
    memcpy(frame, FRAME_START "a", 4);
    frame_put(frame, 1, number);
    frame_put_floats(frame, 2, n, g->kp);
    frame_put_floats(frame, 2 + n, n, g->kd);
    frame_seal(SIZE, frame);
}

static int arm(struct image *m, const struct control_gains *g)
{
    uint8_t frame[SIZE];
    struct answer a;
    make_arm(frame, ++m->number, g);
    return image_put(&m->line, SIZE, frame) || get(m, &a) || a.number != m->number || a.faults || a.all ? -1 : 0;
}

static void flip(uint8_t *frame, int bit)
{
    frame[bit / 8] ^= (uint8_t)(1 << bit % 8);
}

/* ---- loops ---- */

/* A recorded run. */
struct loop {
    int ticks;
    double q[TICKS][N];
    float x[TICKS][NUMBERS], tau[TICKS][N]; /* q, qd, z_ref, zd_ref, zdd_ref */
    struct control_result result;
};

/* The controller on this machine; on the bad line bursts of 0, 1, 2, 3 ticks in 20 come without a frame. */
struct host {
    struct control_model *model;
    struct loop *loop;
    int tick, lossy;
};

static int lost(int tick)
{
    return tick % 20 < tick / 20 % 4;
}

static int host_tick(void *ctx, const float *x, float *tau)
{
    struct host *h = ctx;
    const int k = h->tick++, faults = control_tick(h->model, h->lossy && lost(k) ? NULL : x, tau);
    memcpy(h->loop->x[k], x, 2 * N * sizeof *x);
    if (control_encode_reference(h->model, x, h->loop->x[k] + 2 * N)) return -1;
    memcpy(h->loop->tau[k], tau, sizeof h->loop->tau[k]);
    return faults;
}

/* The same through the image. A frame that gets lost is not sent, damaged, cut off or one of long ago, in turn, and the tick ends
   without an answer: the torque stays. */
static int image_tick(void *ctx, const float *x, float *tau)
{
    struct image *m = ctx;
    const int k = m->tick++, bad = m->lossy && lost(k);
    uint8_t frame[SIZE];
    struct answer a = {0, 0, 0, 0, {0}};
    float numbers[NUMBERS];
    memcpy(numbers, x, 2 * N * sizeof *x);
    if (control_encode_reference(m->model, x, numbers + 2 * N)) return -1;
    make_tick(frame, bad && k % 4 == 3 ? m->number - 5 : m->number + 1, numbers);
    m->number++;
    if (bad && k % 4 == 1) flip(frame, 7919 * k % (8 * SIZE));
    if (image_put(&m->line, bad && k % 4 == 0 ? 0 : bad && k % 4 == 2 ? k % SIZE : SIZE, frame)) return -1;
    if (!bad) {
        if (get(m, &a)) return -1;
        memcpy(tau, a.tau, sizeof a.tau);
        m->used += a.used;
    }
    m->different += memcmp(numbers, m->want->x[k], sizeof numbers) || memcmp(tau, m->want->tau[k], sizeof m->want->tau[k]) ||
                    (!bad && a.number != m->number) || (!m->lossy && a.all);
    return bad ? ROLN_FAULT_STATUS : (int)(a.faults & 0xffff);
}

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

/* `want` is the same loop on this machine. */
static void test_loop(const char *core, const struct control_reference *r, struct control_model *model,
                      const struct control_gains *g, const struct loop *want, int lossy)
{
    static double q[TICKS][N];
    const int ticks = want->ticks;
    struct control_result result;
    struct image m;
    const double start = seconds();
    if (!CHECK(image_open(&m, core) == 0)) return;
    m.model = model, m.want = want, m.lossy = lossy;
    if (CHECK(arm(&m, g) == 0)) {
        CHECK(control_loop(model, r, image_tick, &m, 0, ticks, &result, q[0]) == 0);
        CHECK(m.tick == ticks && m.different == 0);
        CHECK(memcmp(q, want->q, (size_t)ticks * sizeof *q) == 0);
        CHECK(result.rms == want->result.rms && result.tau == want->result.tau && result.faults == want->result.faults);
        printf("%-6s %8d   %8d   %10.2f   %12.0f   %6.1f\n", core, ticks, ticks - m.different, 1e3 * result.rms,
               m.used / (ticks - result.faults), seconds() - start);
        fflush(stdout);
    }
    image_stop(&m.line);
}

/* ---- one fault after the other ---- */

/* Frames of the clean loop; what is answered to frame k is tau[k] or, of a bad tick, what was answered before. */
struct script {
    struct image m;
    const struct loop *loop;
    uint32_t number, all; /* of the last frame that was used; faults since armed */
    int k, dead;
    float tau[N];
    uint8_t frame[SIZE];
};

static void send_tick(struct script *s, uint32_t number, int k)
{
    make_tick(s->frame, number, s->loop->x[k]);
    image_put(&s->m.line, SIZE, s->frame);
}

/* The next answer: number, faults, tau; all faults since armed, with `unseen` of ticks that had no answer. */
static void expect(struct script *s, uint32_t faults, uint32_t unseen, const float *tau, int line)
{
    struct answer a;
    s->m.number = s->number;
    s->dead = s->dead || get(&s->m, &a);
    s->all |= faults | unseen;
    memmove(s->tau, tau, sizeof s->tau);
    const int ok = !s->dead && a.number == s->number && a.faults == faults && a.all == s->all &&
                   !memcmp(a.tau, s->tau, sizeof a.tau);
    if (!ok && !s->dead)
        printf("number %u, faults %x, all %x, tau %g .. instead of %u, %x, %x, %g ..\n", (unsigned)a.number, (unsigned)a.faults,
               (unsigned)a.all, (double)a.tau[0], (unsigned)s->number, (unsigned)faults, (unsigned)s->all, (double)tau[0]);
    check_that(ok, "the answer", __FILE__, line);
}

static const float none[N];
#define TICK(number_, faults, unseen) \
    (send_tick(s, s->number = (number_), ++s->k), expect(s, faults, unseen, s->loop->tau[s->k], __LINE__))
#define TICK_OFF(faults) (send_tick(s, ++s->number, ++s->k), expect(s, ROLN_FAULT_EXPIRED | (faults), 0, none, __LINE__))
#define SILENT(faults) expect(s, faults, 0, s->tau, __LINE__)
#define SILENT_OFF() expect(s, OFF, 0, none, __LINE__)

static void rearm(struct script *s, const struct control_gains *g, uint32_t number, uint32_t faults)
{
    make_arm(s->frame, s->number = number, g);
    image_put(&s->m.line, SIZE, s->frame);
    s->all = 0;
    expect(s, faults, 0, none, __LINE__);
}

/* Faults that the next frame ends: no tick is lost. Every `stride`-th bit of a frame. */
static void test_bytes(struct script *s, int stride)
{
    uint64_t seed = 1;
    for (int bit = 0; bit < 8 * SIZE; bit += stride) {
        make_tick(s->frame, s->number + 1, s->loop->x[s->k + 1]);
        flip(s->frame, bit);
        image_put(&s->m.line, SIZE, s->frame);
        TICK(s->number + 1, LINK_NOISE, 0);
    }
    for (int cut = 1; cut < SIZE; cut += 1 + stride / 2) {
        make_tick(s->frame, s->number + 1, s->loop->x[s->k + 1]);
        image_put(&s->m.line, cut, s->frame);
        TICK(s->number + 1, LINK_NOISE, 0);
    }
    for (int count = 1; count < 3 * SIZE; count = 2 * count + 1) { /* false beginnings in the garbage, one just before the frame */
        uint8_t garbage[3 * SIZE];
        for (int i = 0; i < count; i++) garbage[i] = (uint8_t)roln_randint(256, &seed);
        for (int i = 0; i + 4 <= count; i += 60) memcpy(garbage + i, FRAME_START "t", 4);
        memcpy(garbage + count - 1, FRAME_START, 1);
        image_put(&s->m.line, count, garbage);
        TICK(s->number + 1, LINK_NOISE, 0);
    }
    TICK(s->number + 1, 0, 0);
}

/* Numbers that are not new, and numbers left out. */
static void test_numbers(struct script *s, const struct control_gains *g)
{
    static const uint32_t back[] = {0, 1, 5, 0x7fffffff, 0x80000000};
    uint8_t old[SIZE];
    make_arm(old, s->number, g);
    TICK(s->number + 1, 0, 0);
    for (int i = 0; i < 5; i++) { /* with other contents, too */
        send_tick(s, s->number - back[i], i % 2 ? s->k : s->k + 7);
        TICK(s->number + 1, LINK_OLD, 0);
    }
    for (uint32_t gap = 1; gap <= CONTROL_HOLD; gap++) {
        TICK(s->number + 1 + gap, LINK_GAP, ROLN_FAULT_STATUS);
        TICK(s->number + 1, 0, 0);
    }
    for (int i = 0; i < 2; i++) {
        s->number += i ? 1u << 30 : CONTROL_HOLD + 1;
        s->all |= ROLN_FAULT_STATUS;
        TICK_OFF(LINK_GAP);
        TICK_OFF(0);
        image_put(&s->m.line, SIZE, old); /* the frame that armed once does not arm again */
        TICK_OFF(LINK_OLD);
        make_arm(s->frame, s->number + 1, g);
        flip(s->frame, 100);
        image_put(&s->m.line, SIZE, s->frame);
        TICK_OFF(LINK_NOISE);
        rearm(s, g, s->number + 1, 0);
        TICK(s->number + 1, 0, 0);
    }
    rearm(s, g, 0x80000000, 0);
    rearm(s, g, 0xfffffffd, 0);
    for (int i = 0; i < 4; i++) TICK(s->number + 1, 0, 0);

    float x[NUMBERS]; /* whole, new, and not a number: the guard's own */
    memcpy(x, s->loop->x[s->k + 1], sizeof x);
    x[3] = NAN;
    make_tick(s->frame, ++s->number, x);
    image_put(&s->m.line, SIZE, s->frame);
    expect(s, ROLN_FAULT_INPUT | ROLN_FAULT_STATUS, 0, s->tau, __LINE__);
    TICK(s->number + 1, 0, 0);
}

/* Ticks that end at the deadline. */
static void test_deadline(struct script *s, const struct control_gains *g)
{
    SILENT(BAD);                           /* lost: held, */
    TICK(s->number + 2, 0, 0);             /* and the next one is good */
    send_tick(s, s->number, s->k + 5);     /* repeated: no data */
    SILENT(BAD | LINK_OLD);
    TICK(s->number + 1, 0, 0);             /* late: still new */
    make_tick(s->frame, s->number + 1, s->loop->x[s->k + 1]);
    flip(s->frame, 8 * SIZE - 1);
    image_put(&s->m.line, SIZE, s->frame);            /* damaged */
    SILENT(BAD | LINK_NOISE);
    TICK(s->number + 2, 0, 0);
    make_tick(s->frame, s->number + 1, s->loop->x[s->k + 1]);
    image_put(&s->m.line, SIZE - 1, s->frame);        /* cut off: noticed when more comes */
    SILENT(BAD);
    TICK(s->number + 2, LINK_NOISE, 0);

    for (int i = 0; i < CONTROL_HOLD; i++) SILENT(BAD);
    TICK(s->number + 1 + CONTROL_HOLD, 0, 0);
    SILENT(BAD);                           /* deadlines and numbers left out add up, */
    TICK(s->number + 1 + CONTROL_HOLD, LINK_GAP, 0);
    SILENT(BAD);                           /* one more is too much */
    s->number += CONTROL_HOLD + 1;
    TICK_OFF(LINK_GAP);
    rearm(s, g, s->number + 1, 0);
    TICK(s->number + 1, 0, 0);

    for (int i = 0; i < CONTROL_HOLD; i++) SILENT(BAD);
    SILENT_OFF();
    SILENT_OFF();
    TICK_OFF(0);                           /* off until armed */
    rearm(s, g, s->number + 1, 0);
    TICK(s->number + 1, 0, 0);
}

static void test_faults(const char *core, const struct control_gains *g, const struct loop *loop)
{
    static struct script script;
    struct script *s = &script;
    const int host = strcmp(core, "host") == 0;
    const double start = seconds();
    const long passed = check_passed;
    memset(s, 0, sizeof *s);
    if (!CHECK(image_open(&s->m, core) == 0)) return;
    s->loop = loop;
    send_tick(s, 1, 0);
    rearm(s, g, 2, LINK_OLD); /* nothing but that arms */
    s->k = 200;
    test_numbers(s, g);
    rearm(s, g, s->number + 1, 0);
    test_bytes(s, host ? 1 : 29);
    if (!host) test_deadline(s, g); /* that board has no clock */
    image_stop(&s->m.line);
    printf("%-6s faults: %ld answers as expected, %.0f s\n", core, check_passed - passed - 1, seconds() - start);
    fflush(stdout);
}

int main(int argc, char **argv)
{
    const int test = argc > 1 && strcmp(argv[1], "test") == 0, ticks = test ? PART : TICKS;
    static struct loop clean, bad;
    const struct control_reference r = control_reference(1);
    struct control_model *model = control_load(CONTROL_MODEL);
    struct control_gains g;
    signal(SIGPIPE, SIG_IGN);
    alarm(LIMIT);
    if (!CHECK(model && control_gains(model, 10, 1, &g) == 0)) return 1;
    for (int lossy = 0; lossy < 2; lossy++) {
        struct loop *l = lossy ? &bad : &clean;
        struct host h = {model, l, 0, lossy};
        l->ticks = lossy ? ticks / 10 : ticks;
        control_start(model, CONTROL_LATENT, &g);
        CHECK(control_loop(model, &r, host_tick, &h, 0, l->ticks, &l->result, l->q[0]) == 0);
    }
    CHECK(clean.result.faults == 0 && bad.result.faults >= bad.ticks * 7 / 100);
    printf("core      ticks   the same   error, mrad   instructions   seconds\n");
    for (int i = 1 + test; i < argc; i++) {
        test_loop(argv[i], &r, model, &g, &clean, 0);
        test_loop(argv[i], &r, model, &g, &bad, 1);
        test_faults(argv[i], &g, &clean);
    }
    control_free(model);
    printf("figure: %d of %d ticks\n", ticks, TICKS);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
