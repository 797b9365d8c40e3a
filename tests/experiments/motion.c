/* SPDX-License-Identifier: MIT */
/* motion.c - recorded motion as the models see it, and its POD. */
#include <stdlib.h>
#include <string.h>

#include "experiment.h"
#include "solve.h"

enum { SEED = 1 }; /* of all sets but those that say another */

static roln_real *room(size_t n)
{
    roln_real *p = calloc(n ? n : 1, sizeof *p);
    if (!p) fprintf(stderr, "motion: out of memory\n"), exit(1);
    return p;
}

static roln_real *room_of(size_t n, const double *x)
{
    roln_real *p = room(n);
    for (size_t i = 0; i < n; i++)
        p[i] = (roln_real)x[i];
    return p;
}

/* tau_mid and qdd, as somebody with recordings has them: central differences of qd, and the force that belongs to those. */
static void middle(struct motion *d)
{
    const int N = d->N;
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i < d->samples; i++) {
            const int lo = i > 0 ? i - 1 : i, hi = i + 1 < d->samples ? i + 1 : i;
            const size_t row = (size_t)(k * d->samples) * (size_t)N, at = row + (size_t)(i * N);
            for (int j = 0; j < N; j++) {
                d->qdd[at + (size_t)j] = (d->qd[row + (size_t)(hi * N + j)] - d->qd[row + (size_t)(lo * N + j)]) /
                                         (roln_real)((hi - lo) * d->dt);
                if (d->tau) d->tau_mid[at + (size_t)j] = (d->tau[row + (size_t)(lo * N + j)] + d->tau[at + (size_t)j]) / 2;
            }
        }
}

int motion_simulate(struct motion *d, enum truth_system system, enum truth_split split, int seed, int count, double force,
                    const roln_real *mean)
{
    struct truth_set s;
    if (truth_generate(&s, system, split, (uint64_t)(seed > 0 ? seed : SEED), 0, count, truth_samples(system)) != 0) return -1;
    const size_t rows = (size_t)s.count * (size_t)s.samples, N = (size_t)s.dof, total = rows * N;
    memset(d, 0, sizeof *d);
    d->system = system, d->count = s.count, d->samples = s.samples, d->N = s.dof, d->dt = s.dt;
    d->q = room_of(total, s.q), d->qd = room_of(total, s.qd), d->qdd = room(total), d->mean = room(N);
    d->force = force;
    if (force > 0) d->tau = room_of(total, s.tau_model), d->tau_mid = room(total);
    for (size_t i = 0; i < total && d->tau; i++)
        d->tau[i] /= (roln_real)force;
    middle(d);
    for (size_t j = 0; j < N; j++) {
        double sum = 0;
        for (size_t i = j; i < total && !mean; i += N)
            sum += s.q[i];
        d->mean[j] = mean ? mean[j] : (roln_real)(sum / (double)rows);
    }
    truth_free(&s);
    return 0;
}

void motion_free(struct motion *d)
{
    free(d->q), free(d->qd), free(d->qdd), free(d->tau), free(d->tau_mid), free(d->mean);
    memset(d, 0, sizeof *d);
}

/* Savitzky-Golay: from the parabola through 2 half + 1 samples about each sample (at the ends: through the first or last of them)
   of x [samples][N], into c [3][samples][N]: value, first and second derivative by time. */
static void parabola(int samples, int N, int half, double dt, const roln_real *x, roln_real *c)
{
    const double s0 = 2 * half + 1, s2 = half * (half + 1.) * s0 / 3, s4 = s2 * (3. * half * (half + 1) - 1) / 5;
    const size_t plane = (size_t)(samples * N);
    for (int i = 0; i < samples; i++) {
        const int mid = i < half ? half : i > samples - 1 - half ? samples - 1 - half : i;
        const double u = i - mid, det = s0 * s4 - s2 * s2;
        for (int j = 0; j < N; j++) {
            double y0 = 0, y1 = 0, y2 = 0;
            for (int k = -half; k <= half; k++) {
                const double y = (double)x[(mid + k) * N + j];
                y0 += y, y1 += k * y, y2 += (double)k * k * y;
            }
            const double c0 = (s4 * y0 - s2 * y2) / det, c1 = y1 / s2, c2 = (s0 * y2 - s2 * y0) / det;
            roln_real *to = c + i * N + j;
            to[0] = (roln_real)(c0 + u * (c1 + u * c2));
            to[plane] = (roln_real)((c1 + 2 * u * c2) / dt);
            to[2 * plane] = (roln_real)(2 * c2 / (dt * dt));
        }
    }
}

int motion_smooth(struct motion *a, const struct motion *d, int half)
{
    const size_t length = (size_t)(d->samples * d->N), total = (size_t)d->count * length;
    roln_real *c = room(3 * length);
    *a = *d;
    a->q = room(total), a->qd = room(total), a->qdd = room(total), a->mean = room((size_t)d->N);
    memcpy(a->mean, d->mean, (size_t)d->N * sizeof *d->mean);
    if (d->tau) a->tau = room(total), a->tau_mid = room(total);
    for (size_t at = 0; at < total; at += length) {
        parabola(d->samples, d->N, half, d->dt, d->q + at, c);
        memcpy(a->q + at, c, length * sizeof *c);
        memcpy(a->qd + at, c + length, length * sizeof *c);
        memcpy(a->qdd + at, c + 2 * length, length * sizeof *c);
        if (!d->tau) continue;
        parabola(d->samples, d->N, half, d->dt, d->tau_mid + at, c);
        memcpy(a->tau_mid + at, c, length * sizeof *c);
        memcpy(a->tau + at, d->tau + at, length * sizeof *c);
    }
    free(c);
    return 0;
}

int pod_fit(struct pod *p, const struct motion *d, int r)
{
    p->N = d->N, p->r = r;
    p->W = malloc((size_t)(p->N * r) * sizeof *p->W);
    return p->W ? pod_solve(p->N, (size_t)(d->count * d->samples), d->q, d->mean, r, p->W) : -1;
}

void pod_free(struct pod *p)
{
    free(p->W);
    memset(p, 0, sizeof *p);
}

/* y [rows][r] = (x - mean) W. */
static roln_real *project(int rows, const struct pod *p, const roln_real *x, const roln_real *mean)
{
    const int N = p->N, r = p->r;
    roln_real *y = room((size_t)rows * (size_t)r);
    double *sum = malloc((size_t)r * sizeof *sum);
    for (int i = 0; i < rows && sum; i++) {
        memset(sum, 0, (size_t)r * sizeof *sum);
        for (int j = 0; j < N; j++) {
            const double v = (double)x[(size_t)i * (size_t)N + (size_t)j] - (mean ? (double)mean[j] : 0);
            for (int k = 0; k < r; k++)
                sum[k] += v * p->W[j * r + k];
        }
        for (int k = 0; k < r; k++)
            y[(size_t)i * (size_t)r + (size_t)k] = (roln_real)sum[k];
    }
    free(sum);
    return y;
}

int motion_project(struct motion *a, const struct motion *d, const struct pod *p)
{
    const int rows = d->count * d->samples;
    *a = *d;
    a->N = p->r;
    a->q = project(rows, p, d->q, d->mean), a->qd = project(rows, p, d->qd, NULL), a->qdd = project(rows, p, d->qdd, NULL);
    a->tau = d->tau ? project(rows, p, d->tau, NULL) : NULL;
    a->tau_mid = d->tau ? project(rows, p, d->tau_mid, NULL) : NULL;
    a->mean = room((size_t)p->r);
    return 0;
}
