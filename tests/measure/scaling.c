/* SPDX-License-Identifier: MIT */
/* scaling.c - times of a step of Gauss-Newton of examples/train.c on 1 to 1,024 processes: the tables of docs/training.md, "Many
   machines". Parts of a step are measured on one core, in seconds of the processor. Messages are computed from their sizes.

   Measured: rows of samples and of windows; the slowest band of the sums; the work that each process repeats, which scales rows,
   factors and solves. Computed: b bytes on P processes take log2(P) latencies and b / rate; a combination by or has 2 b bytes. Two
   networks: 10 Gbit/s with 20 us, 100 Gbit/s with 3 us.

       gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples tests/measure/scaling.c -o scaling -lm */

#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#define ROLN_GN_ROWS 2000
#include "pend16.h"

enum {
    N = pend16_N,
    SAMPLES = 4000,
    ROWS = 2000,
    PART = ROWS / 16,
    WINDOWS = 16 * (PART / 20),
    JUDGES = 500,
    STEPS = 25,
    STRIDE = 4,
    SIDE = pend16_newton_side,
    SIZE = pend16_newton_size,
    MOST = 1024,
    REPEATS = 5,
    CALLS = 12 /* of MPI in a step */
};

static float q[SAMPLES][N], qd[SAMPLES][N], qdd[SAMPLES][N], qbar[N];
static pend16_params params;
static pend16_residuals residuals;
static pend16_newton newton;
static pend16_rows_work work;
static pend16_start scratch;
static pend16_chart sums;
static float sum_work[ROLN_SYM_WORK];
static const roln_newton_opt opt = {8, 1, 20, NULL};

static double seconds(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

/* A motion in 4 slow sines, 200 samples a second. */
static void move(void)
{
    int i, j, k;
    for (i = 0; i < SAMPLES; i++)
        for (j = 0; j < N; j++)
            for (k = 1; k <= 4; k++) {
                const double w = 1.7 * k, phase = w * i * 0.005, size = 0.2 * sin((double)j * k + k);
                q[i][j] += (float)(size * sin(phase)), qd[i][j] += (float)(size * w * cos(phase));
                qdd[i][j] -= (float)(size * w * w * sin(phase));
            }
}

/* Seconds of `count` rows, of windows of so many steps or of samples. */
static double time_of_rows(int count, int steps, int again)
{
    static const roln_loss weights = {.qd_pred = 0.1F, .q_pred = 1, .qdd_pred = 1};
    static int start[ROWS];
    double least = 1e30;
    int k, repeat;
    roln_batch b = {.count = count, .steps = steps, .stride = STRIDE, .start = start, .q = q[0], .qd = qd[0]};
    b.qdd = steps > 0 ? NULL : qdd[0];
    for (k = 0; k < count; k++)
        start[k] = k * 397 % (SAMPLES - STEPS * STRIDE);
    for (repeat = 0; repeat < REPEATS; repeat++) {
        const double from = seconds();
        if (pend16_rows(&params, &weights, &b, 0.02F, 0, again, &residuals, &work) != ROLN_OK) exit(1);
        least = fmin(least, seconds() - from);
    }
    return least;
}

/* Seconds of the band of the sums that takes longest, of the first, the last and one in the middle. */
static double time_of_band(int processes)
{
    const int which[3] = {0, processes / 2, processes - 1};
    double most = 0;
    int k, repeat;
    for (k = 0; k < 3; k++) {
        const int from = (int)(SIDE * sqrt((double)which[k] / processes)), to = (int)(SIDE * sqrt((which[k] + 1.0) / processes));
        double least = 1e30;
        for (repeat = 0; repeat < (processes > 1 ? REPEATS : 2); repeat++) {
            const double begin = seconds();
            pend16_newton_normal_equations(&opt, ROWS, from, to, &residuals, &newton, sum_work);
            least = fmin(least, seconds() - begin);
        }
        most = fmax(most, least);
    }
    return most;
}

/* Seconds that every process takes by itself in a step: rows are scaled, the system is solved, residuals are compared. */
static double time_of_own(void)
{
    double least = 1e30;
    int repeat;
    for (repeat = 0; repeat < REPEATS; repeat++) {
        const double from = seconds();
        if (pend16_newton_rows(&params, &opt, ROWS, &residuals, &newton) != ROLN_OK) exit(1);
        if (pend16_newton_step(&params, &opt, ROWS, &residuals, &newton) != ROLN_OK) exit(1);
        least = fmin(least, seconds() - from);
    }
    return least;
}

/* Measured, in s. */
static struct {
    double sample, window, judge_sample, judge_window, own;
} t;

/* Seconds of the largest share of `samples` and `windows` rows on P processes. A window is not divided. */
static double share_of(double samples, double windows, double sample, double window, int P)
{
    const double most = (samples * sample + windows * window) / P;
    return fmax(most, windows * window > 0 ? window : sample);
}

/* Seconds of the messages of a step. */
static double time_of_messages(int P, double latency, double rate)
{
    const double hops = ceil(log2(P)), row = 4.0 * (SIZE + 1), triangle = 4.0 * SIDE * (SIDE + 1.0) / 2;
    const double samples = 4.0 * (3 * N + 2 * N) * (ROWS - WINDOWS + WINDOWS * (STEPS * STRIDE + 1.0));
    const double bytes = ROWS * row + triangle + 4.0 * JUDGES + 2 * samples;
    return P > 1 ? CALLS * hops * latency + bytes / rate : 0;
}

static const int counts[] = {1, 4, 16, 64, 256, MOST};
static double step[6]; /* seconds, at 10 Gbit/s */

/* Strong scaling. */
static void table(void)
{
    const double judges = (double)JUDGES / ROWS;
    double first = 0;
    int i;
    printf("| processes | rows, ms | sums, ms | repeated, ms | messages at 10 Gbit/s, ms | step, ms | times as fast | "
           "messages at 100 Gbit/s, ms | times as fast |\n|---|---|---|---|---|---|---|---|---|\n");
    for (i = 0; i < 6; i++) {
        const int P = counts[i];
        const double rows = share_of(ROWS - WINDOWS, WINDOWS, t.sample, t.window, P) +
                            share_of(judges * (ROWS - WINDOWS), judges * WINDOWS, t.judge_sample, t.judge_window, P);
        const double band = time_of_band(P), alone = rows + band + t.own;
        const double slow = time_of_messages(P, 20e-6, 1.1e9), fast = time_of_messages(P, 3e-6, 11e9);
        if (P == 1) first = alone;
        step[i] = alone + slow;
        printf("| %d | %.3g | %.3g | %.3g | %.3g | %.3g | %.3g | %.3g | %.3g |\n", P, 1e3 * rows, 1e3 * band, 1e3 * t.own,
               1e3 * slow, 1e3 * step[i], first / step[i], 1e3 * fast, first / (alone + fast));
    }
}

/* Seconds of the sums of a chart, of one sample. */
static double time_of_chart(void)
{
    double least = 1e30;
    int repeat;
    for (repeat = 0; repeat < REPEATS; repeat++) {
        const double from = seconds();
        if (pend16_chart_add(&params, SAMPLES, q[0], &sums, &scratch.chart_add) != ROLN_OK) exit(1);
        least = fmin(least, seconds() - from);
    }
    return least / SAMPLES;
}

/* Weak scaling: a million samples in each process. */
static void weak(void)
{
    const double own = 1e6 * time_of_chart(), bytes = sizeof sums;
    int i;
    printf(
        "\n| processes | samples, millions | sums of the chart, s | their messages at 10 Gbit/s, ms | a step at 10 Gbit/s, ms |\n"
        "|---|---|---|---|---|\n");
    for (i = 0; i < 6; i++) {
        const int P = counts[i];
        const double messages = P > 1 ? P * (ceil(log2(P)) * 20e-6 + bytes / 1.1e9) : 0;
        printf("| %d | %d | %.3g | %.3g | %.3g |\n", P, P, own, 1e3 * messages, 1e3 * step[i]);
    }
}

int main(void)
{
    uint64_t seed = 1;
    move();
    if (pend16_init_pod(&params, SAMPLES, q[0], qd[0], qbar, &seed, &scratch.init_pod) != ROLN_OK) return 1;
    newton.state.lambda = 0.01F;
    t.window = time_of_rows(20, STEPS, 0) / 20, t.judge_window = time_of_rows(20, STEPS, 1) / 20;
    t.judge_sample = time_of_rows(JUDGES, 0, 1) / JUDGES, t.sample = time_of_rows(ROWS, 0, 0) / ROWS;
    if (pend16_newton_rows(&params, &opt, ROWS, &residuals, &newton) != ROLN_OK) return 1;
    pend16_newton_normal_equations(&opt, ROWS, 0, SIDE, &residuals, &newton, sum_work);
    t.own = time_of_own();
    printf("%d parameters, %d rows of which %d are windows of %d steps; a row takes %.3g us, that of a window %.3g us\n\n", SIZE,
           ROWS, WINDOWS, STEPS, 1e6 * t.sample, 1e6 * t.window);
    table();
    weak();
    return 0;
}
