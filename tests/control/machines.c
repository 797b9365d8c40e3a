/* SPDX-License-Identifier: MIT */
/* machines - processor in the loop: the machines of examples/ in MuJoCo, their controllers images in QEMU, in lock step.
     machines CORE ..        from the top of the repository, after `make firmware`

   The torques are those of the same loop with the image of this machine, bit for bit, and the loop does what the example does. */
#include <math.h>
#include <mujoco/mujoco.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "examples/firmware/frame.h"
#include "../unit/check.h"
#include "image.h"

enum { STEPS = 4096, TICKS = 4000, MOST = 6, NUMBERS = 18, LIMIT = 1800 /* s for everything */ };
#define TICK 1e-3
#define TURN 6.283185307179586

struct machine {
    const char *name;
    int joints, forces;
    void (*place)(mjData *d);                   /* where it starts */
    double (*error)(const mjData *d, double t); /* what shall be small in the second half of the loop */
    double bound;
    int numbers;                                /* of a reference, beside the counts */
    void (*reference)(double t, float *ref);
};

struct result {
    float tau[TICKS][MOST];
    double worst, used; /* error; instructions of a tick */
    int ticks, faults;
};

static int get(const struct image_line *l, int words, uint32_t number, uint8_t *answer)
{
    return image_get(l, 4 * words, answer) || !frame_whole(4 * words, answer) || frame_get(answer, 1) != number ? -1 : 0;
}

/* A tick of the image: encoder counts to it, torques back. */
static int tick(const struct image_line *l, const struct machine *k, const mjData *d, int number, struct result *r)
{
    uint8_t frame[4 * 32], answer[4 * (5 + MOST)];
    const int size = 4 * (3 + k->joints + k->numbers), words = 5 + k->forces;
    float ref[NUMBERS];
    memcpy(frame, FRAME_START "t", 4);
    frame_put(frame, 1, (uint32_t)number + 1);
    for (int i = 0; i < k->joints; i++)
        frame_put(frame, 2 + i, (uint32_t)(int)floor(d->qpos[i] / TURN * STEPS + 0.5));
    if (k->reference) k->reference(number * TICK, ref);
    for (int i = 0; i < k->numbers; i++)
        frame_put_floats(frame, 2 + k->joints + i, 1, ref + i);
    frame_seal(size, frame);
    if (image_put(l, size, frame) || get(l, words, (uint32_t)number + 1, answer)) return -1;
    r->faults |= (int)frame_get(answer, 2);
    r->used += frame_get(answer, 3);
    frame_get_floats(answer, 4, k->forces, r->tau[number]);
    return 0;
}

static void loop(const char *core, const struct machine *k, const mjModel *m, struct result *r)
{
    struct image_line l;
    mjData *d = mj_makeData(m);
    const int steps = (int)(TICK / m->opt.timestep + 0.5);
    memset(r, 0, sizeof *r);
    k->place(d);
    if (CHECK(image_start(&l, core, k->name) == 0)) {
        uint8_t up[4 * (5 + MOST)];
        const int ready = CHECK(get(&l, 5 + k->forces, 0, up) == 0);
        for (; ready && r->ticks < TICKS && tick(&l, k, d, r->ticks, r) == 0; r->ticks++) {
            for (int i = 0; i < k->forces; i++)
                d->ctrl[i] = (double)r->tau[r->ticks][i];
            for (int i = 0; i < steps; i++)
                mj_step(m, d);
            if (r->ticks >= TICKS / 2) r->worst = fmax(r->worst, k->error(d, (r->ticks + 1) * TICK));
        }
        image_stop(&l);
    }
    mj_deleteData(d);
}

static void test_machine(const struct machine *k, int cores, char **core)
{
    static struct result want, got;
    char path[80], error[500];
    mjModel *m;
    snprintf(path, sizeof path, "tests/mujoco/plants/%s.xml", k->name);
    m = mj_loadXML(path, NULL, error, sizeof error);
    if (!CHECK(m != NULL)) return;
    loop("host", k, m, &want);
    CHECK(want.ticks == TICKS);
    for (int i = 0; i < cores; i++) {
        loop(core[i], k, m, &got);
        CHECK(got.ticks == TICKS && got.faults == want.faults && memcmp(got.tau, want.tau, sizeof want.tau) == 0);
        CHECK_BELOW(got.worst, k->bound);
        printf("%-8s %-6s %8d %12.4f %14.0f\n", k->name, core[i], got.ticks, got.worst, got.used / TICKS);
        fflush(stdout);
    }
    mj_deleteModel(m);
}

/* ---- the Furuta pendulum: swung up from rest, upright after two seconds ---- */

static void furuta_place(mjData *d)
{
    d->qpos[1] = 0.01;
}

static double furuta_error(const mjData *d, double t)
{
    (void)t;
    return fabs(remainder(d->qpos[1] - TURN / 2, TURN));
}

/* ---- the arm: along a reference that starts at rest ---- */

static const double arm_middle[6] = {0, 0, -0.75, 0, 0, 0};

static void arm_reference(double t, float *ref)
{
    for (int i = 0; i < 6; i++) {
        const double w = 1.5 + 0.3 * i;
        ref[i] = (float)(arm_middle[i] + 0.3 * (1 - cos(w * t)));
        ref[6 + i] = (float)(0.3 * w * sin(w * t));
        ref[12 + i] = (float)(0.3 * w * w * cos(w * t));
    }
}

static void arm_place(mjData *d)
{
    memcpy(d->qpos, arm_middle, sizeof arm_middle);
}

static double arm_error(const mjData *d, double t)
{
    float ref[NUMBERS];
    double worst = 0;
    arm_reference(t, ref);
    for (int i = 0; i < 6; i++)
        worst = fmax(worst, fabs(d->qpos[i] - (double)ref[i]));
    return worst;
}

int main(int argc, char **argv)
{
    static const struct machine machine[] = {
        {"furuta", 2, 1, furuta_place, furuta_error, 0.02, 0, NULL},
        {"arm", 6, 6, arm_place, arm_error, 0.005, NUMBERS, arm_reference},
    };
    signal(SIGPIPE, SIG_IGN);
    alarm(LIMIT);
    printf("machine  core      ticks   error, rad   instructions\n");
    for (size_t i = 0; i < sizeof machine / sizeof *machine; i++)
        test_machine(&machine[i], argc - 1, argv + 1);
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
