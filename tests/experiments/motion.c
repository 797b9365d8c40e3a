/* motion.c - recorded motion as the models see it, and its POD. */
#include <stdlib.h>
#include <string.h>

#include "experiment.h"
#include "solve.h"

#define SEED 1 /* of all sets */

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

int motion_simulate(struct motion *d, enum truth_system system, enum truth_split split, int first, int count, double force,
                    const roln_real *mean)
{
    struct truth_set s;
    if (truth_generate(&s, system, split, SEED, first, count, truth_samples(system)) != 0) return -1;
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
