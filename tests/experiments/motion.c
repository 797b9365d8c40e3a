/* motion.c - recorded motion as the models see it, and its POD. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

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

int motion_simulate(struct motion *d, enum truth_system system, enum truth_split split, int first, int count, int forces,
                    const roln_real *mean)
{
    struct truth_set s;
    if (truth_generate(&s, system, split, SEED, first, count, truth_samples(system)) != 0) return -1;
    const size_t rows = (size_t)s.count * (size_t)s.samples, N = (size_t)s.dof, total = rows * N;
    memset(d, 0, sizeof *d);
    d->system = system, d->count = s.count, d->samples = s.samples, d->N = s.dof, d->dt = s.dt;
    d->q = room_of(total, s.q), d->qd = room_of(total, s.qd), d->qdd = room(total), d->mean = room(N);
    if (forces) d->tau = room_of(total, s.tau_model), d->tau_mid = room(total);
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

/* Rows of W orthonormal, by Gram-Schmidt, twice. */
static void orthonormalise(int r, int N, double *W)
{
    for (int i = 0; i < r; i++) {
        double *w = W + i * N, norm = 0;
        for (int pass = 0; pass < 2; pass++)
            for (int k = 0; k < i; k++) {
                const double *u = W + k * N;
                double dot = 0;
                for (int j = 0; j < N; j++)
                    dot += u[j] * w[j];
                for (int j = 0; j < N; j++)
                    w[j] -= dot * u[j];
            }
        for (int j = 0; j < N; j++)
            norm += w[j] * w[j];
        for (int j = 0; j < N; j++)
            w[j] /= sqrt(norm);
    }
}

/* Subspace iteration on the covariance, in double: the weakest directions kept are 1e-4 of the strongest, below what an
   eigensolver in float tells apart. Directions need not be told from their neighbours, only from what is left out. */
int pod_fit(struct pod *p, const struct motion *d, int centred, int r)
{
    enum { SWEEPS = 40 };
    const int N = d->N, rows = d->count * d->samples;
    uint64_t seed = 7;
    p->N = N, p->r = r;
    p->W = malloc((size_t)(N * r) * sizeof *p->W);
    double *C = calloc((size_t)(N * N), sizeof *C), *V = malloc((size_t)(r * N) * sizeof *V);
    double *Y = malloc((size_t)(r * N) * sizeof *Y), *x = malloc((size_t)N * sizeof *x), *size = malloc((size_t)r * sizeof *size);
    if (!p->W || !C || !V || !Y || !x || !size || r > N) {
        fprintf(stderr, "pod: no room, or more directions than coordinates\n");
        exit(1);
    }
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < N; j++)
            x[j] = (double)d->q[(size_t)i * (size_t)N + (size_t)j] - (centred ? (double)d->mean[j] : 0);
        for (int a = 0; a < N; a++)
            for (int b = 0; b <= a; b++)
                C[a * N + b] += x[a] * x[b] / rows;
    }
    for (int a = 0; a < N; a++)
        for (int b = 0; b < a; b++)
            C[b * N + a] = C[a * N + b];
    for (int i = 0; i < r * N; i++)
        V[i] = (double)roln_normal(&seed);
    orthonormalise(r, N, V);
    for (int sweep = 0; sweep < SWEEPS; sweep++) {
        memset(Y, 0, (size_t)(r * N) * sizeof *Y);
        for (int i = 0; i < r; i++)
            for (int a = 0; a < N; a++) {
                const double v = V[i * N + a];
                for (int b = 0; b < N; b++)
                    Y[i * N + b] += v * C[a * N + b];
            }
        for (int i = 0; i < r; i++) {
            size[i] = 0;
            for (int j = 0; j < N; j++)
                size[i] += V[i * N + j] * Y[i * N + j];
        }
        memcpy(V, Y, (size_t)(r * N) * sizeof *V);
        for (int i = 1; i < r; i++) /* the strongest first, as Gram-Schmidt wants them */
            for (int k = i; k > 0 && size[k] > size[k - 1]; k--) {
                const double t = size[k];
                size[k] = size[k - 1], size[k - 1] = t;
                memcpy(x, V + k * N, (size_t)N * sizeof *x);
                memcpy(V + k * N, V + (k - 1) * N, (size_t)N * sizeof *x);
                memcpy(V + (k - 1) * N, x, (size_t)N * sizeof *x);
            }
        orthonormalise(r, N, V);
    }
    for (int i = 0; i < r; i++)
        for (int j = 0; j < N; j++)
            p->W[j * r + i] = V[i * N + j];
    free(C), free(V), free(Y), free(x), free(size);
    return 0;
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
