/* SPDX-License-Identifier: MIT */
/* doubt.c - do the deviations of NAME_doubt and NAME_doubt_ahead hold? doubt TEST.csv [JOINT LOW HIGH]

   -DMODEL, -DCONFIG, -DWEIGHTS and -DLIMITS name a model, its config and what the trainer wrote. TEST.csv has recordings that it
   never saw: t, q, qd and, where it has inputs, tau, with a blank line between recordings. Printed are, in bins of novelty, how
   many windows of 25 ms miss accelerations and forces by less than 1, 2 and 3 deviations (a normal error: 68.3, 95.4, 99.7 %), the
   same of z after roll-outs, and ticks beyond limits.novelty. With JOINT, counted from 1, the geometric mean of the deviations of
   zdd where LOW < q < HIGH over that elsewhere, and the same of the errors. Lines `curve NOVELTY COUNT ERROR
   DEVIATION` are for doubt_plot.c: rms over all coordinates, in parts of the deviation of each at novelty 1. */
#include CONFIG
#include WEIGHTS
#include LIMITS
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define PASTE__(a, b) a##_##b
#define PASTE_(a, b) PASTE__(a, b)
#define M(x) PASTE_(MODEL, x)
enum { N = M(N), n = M(n), F = M(force_size), BINS = 5, FINE = 24, LOOKS = 4, STEPS = 1000, MOST = 400000, WIDE = 1 + 2 * N + F };

static roln_real q[MOST * N], qd[MOST * N], tau[MOST * F], row[WIDE];
static int first[10000], recordings, acts; /* first samples; is there a tau */
static double dt;

/* How many errors are within 1, 2, 3 deviations. */
typedef struct {
    long count, within[3];
} share;

static void count_in(share *s, double error, double deviation)
{
    int k;
    s->count++;
    for (k = 0; k < 3; k++)
        s->within[k] += fabs(error) < (k + 1) * deviation;
}

static void print(const char *what, const share *s)
{
    int k;
    printf("%-28s %8ld", what, s->count);
    for (k = 0; k < 3 && s->count > 0; k++)
        printf(" %7.1f %%", 100.0 * (double)s->within[k] / (double)s->count);
    printf("\n");
}

/* Numbers of a line to row; how many. */
static int numbers(char *p)
{
    int k;
    for (k = 0; k < WIDE; k++) {
        char *end;
        row[k] = (roln_real)strtod(p, &end);
        if (end == p) break;
        p = end + (*end == ',');
    }
    return k;
}

static void read_recordings(const char *path)
{
    static char line[100000];
    FILE *const f = fopen(path, "r");
    int samples = 0, begins = 1;
    if (!f || !fgets(line, sizeof line, f)) exit((fprintf(stderr, "cannot read %s\n", path), 1));
    while (samples < MOST && fgets(line, sizeof line, f)) {
        const int count = numbers(line);
        if (count < 1 + 2 * N) {
            begins = 1;
            continue;
        }
        if (begins) first[recordings++] = samples;
        memcpy(q + samples * N, row + 1, N * sizeof *q), memcpy(qd + samples * N, row + 1 + N, N * sizeof *qd);
        acts = count == WIDE;
        if (acts) memcpy(tau + samples * F, row + 1 + 2 * N, F * sizeof *tau);
        if (samples == 1) dt = (double)row[0];
        begins = 0, samples++;
    }
    first[recordings] = samples;
    fclose(f);
}

static M(latent) state_of(int i)
{
    static M(encode_work) w;
    M(state) x;
    M(latent) s;
    memcpy(x.q, q + i * N, sizeof x.q), memcpy(x.qd, qd + i * N, sizeof x.qd);
    if (M(encode)(&M(weights), &x, &s, &w) != ROLN_OK) exit((fprintf(stderr, "sample %d cannot be encoded\n", i), 1));
    return s;
}

/* The mean torque of samples i .. i + count - 1, or NULL. */
static const roln_real *torque(int i, int count)
{
    static roln_real mean[F];
    int j, k;
    for (j = 0; j < F; j++)
        for (mean[j] = 0, k = 0; k < count; k++)
            mean[j] += tau[(i + k) * F + j] / (roln_real)count;
    return acts ? mean : NULL;
}

/* What the model misses of acceleration and force over the window of `steps` samples from i on, to e [2n]. */
static int missed(int i, int steps, roln_real *e)
{
    static M(step_work) w;
    static M(dynamics_work) dynamics;
    const M(latent) end = state_of(i + steps);
    M(latent) s = state_of(i);
    M(equation) at;
    int k;
    if (M(dynamics)(&M(weights), &s, &at, &dynamics) != ROLN_OK) return 0;
    for (k = 0; k < steps; k++)
        if (M(step)(&M(weights), &s, torque(i + k, 1), (roln_real)dt, &w) != ROLN_OK) return 0;
    for (k = 0; k < n; k++)
        e[k] = (end.zd[k] - s.zd[k]) / (roln_real)(dt * steps);
    roln_mm(n, n, 1, at.M, e, e + n);
    return 1;
}

/* What a picture shows: squares of errors and of deviations, in parts of 4 of a decade of novelty, from 0.01 on. */
static struct {
    double error, deviation;
    long count;
} fine[FINE];

static void draw(double novelty, const roln_real *e, const M(doubts) *d)
{
    const int at = (int)fmin(FINE - 1, fmax(0, 4 * log10(novelty) + 8));
    int j;
    for (j = 0; j < n; j++) {
        const double always = (double)M(known).always[j], grows = (double)M(known).grows[j];
        const double one = always * always + grows * grows;
        if (!(one > 0)) continue;
        fine[at].error += (double)(e[j] * e[j]) / one, fine[at].deviation += (double)(d->zdd[j] * d->zdd[j]) / one;
        fine[at].count++;
    }
}

static void print_curve(void)
{
    int k;
    for (k = 0; k < FINE; k++)
        if (fine[k].count >= 10 * n)
            printf("curve %g %ld %g %g\n", pow(10, (k - 7.5) / 4), fine[k].count, sqrt(fine[k].error / (double)fine[k].count),
                   sqrt(fine[k].deviation / (double)fine[k].count));
}

/* Windows of 25 ms, by novelty; with a joint the deviations where low < q < high over those elsewhere. */
static void of_windows(int joint, double low, double high)
{
    static const char *const name[BINS] = {"novelty below 0.5", "0.5 .. 2", "2 .. 10", "10 .. 100", "above 100"};
    static M(doubt_work) w;
    share shares[BINS] = {{0, {0}}};
    const int steps = (int)fmax(1, 0.025 / dt + 0.5);
    double logs[2] = {0, 0}, missing[2] = {0, 0};
    long in[2] = {0, 0}, failed = 0;
    int r, i, k, j;
    for (r = 0; r < recordings; r++)
        for (i = first[r]; i + steps < first[r + 1]; i += steps) {
            const M(latent) s = state_of(i);
            roln_real e[2 * n];
            M(doubts) d;
            if (M(doubt)(&M(weights), &M(known), &s, &d, &w) != ROLN_OK || !missed(i, steps, e)) {
                failed++;
                continue;
            }
            k = d.novelty < 0.5f ? 0 : d.novelty < 2 ? 1 : d.novelty < 10 ? 2 : d.novelty < 100 ? 3 : 4;
            if (joint > 0) {
                const double at = (double)q[i * N + joint - 1];
                const int hole = at > low && at < high;
                for (j = 0; j < n; j++)
                    in[hole]++, logs[hole] += log((double)d.zdd[j]), missing[hole] += log(fabs((double)e[j]) + 1e-9);
            }
            draw((double)d.novelty, e, &d);
            for (j = 0; j < 2 * n; j++)
                count_in(shares + k, (double)e[j], (double)(j < n ? d.zdd[j] : d.force[j - n]));
        }
    for (k = 0; k < BINS; k++)
        print(name[k], shares + k);
    printf("windows that failed: %ld\n", failed);
    if (joint > 0)
        printf("deviation where %g < q%d < %g, %ld windows, over that of %ld others: %.1f, errors %.1f\n", low, joint, high,
               in[1] / n, in[0] / n, exp(logs[1] / (double)in[1] - logs[0] / (double)in[0]),
               exp(missing[1] / (double)in[1] - missing[0] / (double)in[0]));
}

/* Ticks whose novelty the guard would refuse. */
static void of_ticks(void)
{
    static M(doubt_work) w;
    M(doubts) d;
    long beyond = 0;
    int i;
    for (i = 0; i < first[recordings]; i++) {
        const M(latent) s = state_of(i);
        beyond += M(doubt)(&M(weights), &M(known), &s, &d, &w) != ROLN_OK || !(d.novelty <= M(limits).novelty);
    }
    printf("ticks beyond limits.novelty (%g): %ld of %d\n", (double)M(limits).novelty, beyond, first[recordings]);
}

/* Roll-outs of a second in steps of 1 ms: an error of the integrator is not one of the model. */
static void of_rollouts(void)
{
    static M(doubt_ahead_work) w;
    const int stride = (int)fmax(1, 0.001 / dt + 0.5), look[LOOKS] = {100, 250, 500, STEPS};
    share shares[LOOKS] = {{0, {0}}};
    int r, i, h, k, j;
    for (r = 0; r < recordings; r++)
        for (i = first[r]; i + STEPS * stride < first[r + 1]; i += STEPS / 5 * stride) {
            M(latent) s = state_of(i);
            M(outlook) o;
            memset(&o, 0, sizeof o);
            for (h = 1, k = 0; h <= STEPS; h++) {
                const roln_real *const by = torque(i + (h - 1) * stride, stride);
                if (M(doubt_ahead)(&M(weights), &M(known), &s, by, (roln_real)(dt * stride), &o, &w) != ROLN_OK) break;
                if (h != look[k]) continue;
                for (j = 0; j < n; j++) {
                    const roln_real z = state_of(i + h * stride).z[j];
                    const roln_real off = z - roln_lnn_near(&M(model).lnn, j, z, s.z[j]);
                    count_in(shares + k, (double)off, sqrt((double)o.P[j * (2 * n + 1)]));
                }
                k++;
            }
        }
    for (k = 0; k < LOOKS; k++) {
        char what[40];
        snprintf(what, sizeof what, "z after %.0f ms", 1e3 * dt * stride * look[k]);
        print(what, shares + k);
    }
}

int main(int argc, char **argv)
{
    if (argc != 2 && argc != 5) return fprintf(stderr, "doubt TEST.csv [JOINT LOW HIGH]\n"), 1;
    read_recordings(argv[1]);
    printf("%s: %d recordings that were not trained with; within\n", argv[1], recordings);
    printf("%-28s %8s %9s %9s %9s\n", "", "count", "1", "2", "3 deviations");
    of_windows(argc == 5 ? atoi(argv[2]) : 0, argc == 5 ? atof(argv[3]) : 0, argc == 5 ? atof(argv[4]) : 0);
    of_ticks();
    of_rollouts();
    print_curve();
    return 0;
}
