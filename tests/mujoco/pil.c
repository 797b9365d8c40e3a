/* pil - processor in the loop: MuJoCo's chain here, its controller an image in QEMU (examples/firmware/serial.c), between them the
   emulated serial line, in lock step.
     pil CORE ..        from the top of the repository, after `make firmware`

   The loop gives the same states and torques as the one on this machine alone, bit for bit; so does a loop whose line loses, repeats
   and damages frames, with what the guard makes of it. Then one fault after the other. */
#include <errno.h>
#include <poll.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

#include "../../examples/firmware/frame.h"
#include "../check.h"
#include "control.h"

enum {
    N = 16, n = 4, NUMBERS = 2 * N + 3 * n, SIZE = FRAME_SIZE(N, n), ANSWER = FRAME_ANSWER(N),
    TICKS = 10000,  /* of the loop */
    LOSSY = 2000,   /* of the one on a bad line */
    SILENCE = 60,   /* s without an answer: the image is dead */
    LIMIT = 900     /* s for everything */
};
#define BAD (ROLN_FAULT_STATUS | LINK_NONE)       /* what the answer of a tick without a frame says */
#define OFF (BAD | ROLN_FAULT_EXPIRED)

/* ---- the image ---- */

struct image {
    pid_t pid;
    int to, from;
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

/* The image dies with this process, however that ends. */
static int image_open(struct image *m, const char *core)
{
    char path[80];
    int to[2], from[2];
    memset(m, 0, sizeof *m);
    snprintf(path, sizeof path, "build/firmware/%s/examples/firmware/serial.elf", core);
    if (pipe(to)) return -1;
    if (pipe(from)) return -1;
    m->to = to[1], m->from = from[0];
    if ((m->pid = fork()) < 0) return -1;
    if (m->pid > 0) {
        close(to[0]), close(from[1]);
        return 0;
    }
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    signal(SIGPIPE, SIG_DFL);
    if (dup2(to[0], 0) == 0 && dup2(from[1], 1) == 1) {
        for (int f = 3; f < 32; f++) close(f);
        execlp("sh", "sh", "examples/firmware/run.sh", core, path, (char *)NULL);
    }
    perror("pil: run.sh");
    _exit(1);
}

static void image_close(struct image *m)
{
    kill(m->pid, SIGKILL);
    waitpid(m->pid, NULL, 0);
    close(m->to), close(m->from);
}

static int put(const struct image *m, int count, const uint8_t *bytes)
{
    while (count > 0) {
        const ssize_t written = write(m->to, bytes, (size_t)count);
        if (written < 0 && errno != EINTR) return -1;
        if (written > 0) bytes += written, count -= (int)written;
    }
    return 0;
}

static int get(const struct image *m, struct answer *a)
{
    uint8_t bytes[ANSWER];
    for (int have = 0; have < ANSWER;) {
        struct pollfd p = {m->from, POLLIN, 0};
        const ssize_t count = poll(&p, 1, 1000 * SILENCE) == 1 ? read(m->from, bytes + have, (size_t)(ANSWER - have)) : 0;
        if (count <= 0) {
            printf("no answer to frame %u\n", (unsigned)m->number);
            return -1;
        }
        have += (int)count;
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
    return put(m, SIZE, frame) || get(m, &a) || a.number != m->number || a.faults || a.all ? -1 : 0;
}

static void flip(uint8_t *frame, int bit)
{
    frame[bit / 8] ^= (uint8_t)(1 << bit % 8);
}

/* ---- loops ---- */

/* A recorded run. */
struct loop {
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
    if (control_aim(h->model, x, h->loop->x[k] + 2 * N)) return -1;
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
    if (control_aim(m->model, x, numbers + 2 * N)) return -1;
    make_tick(frame, bad && k % 4 == 3 ? m->number - 5 : m->number + 1, numbers);
    m->number++;
    if (bad && k % 4 == 1) flip(frame, 7919 * k % (8 * SIZE));
    if (put(m, bad && k % 4 == 0 ? 0 : bad && k % 4 == 2 ? k % SIZE : SIZE, frame)) return -1;
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
static void test_loop(const char *core, const struct control_reference *r, struct control_model *model, const struct control_gains *g,
                      const struct loop *want, int lossy)
{
    static double q[TICKS][N];
    const int ticks = lossy ? LOSSY : TICKS;
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
    image_close(&m);
}

int main(int argc, char **argv)
{
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
        control_start(model, CONTROL_LATENT, &g);
        CHECK(control_loop(model, &r, host_tick, &h, 0, lossy ? LOSSY : TICKS, &l->result, l->q[0]) == 0);
    }
    printf("%d %d\n", clean.result.faults, bad.result.faults);
    CHECK(clean.result.faults == 0 && bad.result.faults == LOSSY * 3 / 40);
    printf("core      ticks   the same   error, mrad   instructions   seconds\n");
    for (int i = 1; i < argc; i++) {
        test_loop(argv[i], &r, model, &g, &clean, 0);
        test_loop(argv[i], &r, model, &g, &bad, 1);
    }
    control_free(model);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
