/* SPDX-License-Identifier: MIT */
/* fit.c - no model: whole trajectories as a quadratic polynomial of two numbers of their start. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

enum { TERMS = 6 };

/* 1, a, b, a^2, a b, b^2 of (a, b) = W^T (q - mean) / scale */
static void terms(const struct pod *p, const roln_real *q, const roln_real *mean, const double scale[2], roln_real x[TERMS])
{
    double a[2] = {0, 0};
    for (int j = 0; j < p->N; j++)
        for (int k = 0; k < 2; k++)
            a[k] += p->W[2 * j + k] * (double)(q[j] - mean[j]) / scale[k];
    const double all[TERMS] = {1, a[0], a[1], a[0] * a[0], a[0] * a[1], a[1] * a[1]};
    for (int i = 0; i < TERMS; i++)
        x[i] = (roln_real)all[i];
}

/* Least squares at every sample, with the same terms: q(t) = sum_k w_k q_k(t) over the training trajectories k,
   w = X (X^T X)^-1 x. */
int fit_measure(const struct motion *train, const struct motion *test, FILE *out)
{
    const int N = train->N, count = train->count;
    const size_t length = (size_t)train->samples * (size_t)N;
    roln_real *start = malloc((size_t)count * (size_t)N * sizeof *start), *mean = calloc((size_t)N, sizeof *mean);
    roln_real *X = calloc((size_t)(count * TERMS), sizeof *X);
    roln_real S[TERMS * TERMS], inverse[TERMS * TERMS], work[TERMS * TERMS], x[TERMS], y[TERMS];
    double e = 0, var = 0, scale[2] = {1, 1}, *w = malloc((size_t)count * sizeof *w);
    struct motion first = *train;
    struct pod pod;
    if (!start || !mean || !X || !w) return perror("fit"), -1;
    for (int k = 0; k < count; k++)
        memcpy(start + k * N, train->q + (size_t)k * length, (size_t)N * sizeof *start);
    for (int i = 0; i < count * N; i++)
        mean[i % N] += start[i] / (roln_real)count;
    first.q = start, first.mean = mean, first.samples = 1;
    if (pod_fit(&pod, &first, 2) != 0) return -1;
    for (int pass = 0; pass < 2; pass++) { /* the second with a, b of size 1 */
        double sum[2] = {0, 0};
        for (int k = 0; k < count; k++) {
            terms(&pod, start + k * N, mean, scale, X + k * TERMS);
            for (int i = 0; i < 2; i++)
                sum[i] += (double)(X[k * TERMS + 1 + i] * X[k * TERMS + 1 + i]) / count;
        }
        for (int i = 0; i < 2 && pass == 0; i++)
            scale[i] = sqrt(sum[i]);
    }
    memset(S, 0, sizeof S);
    roln_mm_at(TERMS, count, TERMS, X, X, S);
    if (roln_inv(TERMS, S, inverse, work) != ROLN_OK) return fprintf(stderr, "fit: two numbers do not tell the starts apart\n"), -1;
    for (int t = 0; t < test->count; t++) {
        const roln_real *q = test->q + (size_t)t * length;
        terms(&pod, q, mean, scale, x);
        roln_mm(1, TERMS, TERMS, x, inverse, y);
        for (int k = 0; k < count; k++)
            w[k] = (double)roln_dot(TERMS, X + k * TERMS, y);
        for (size_t i = 0; i < length; i++) {
            double sum = 0;
            for (int k = 0; k < count; k++)
                sum += w[k] * (double)train->q[(size_t)k * length + i];
            const double d = sum - (double)q[i], c = (double)(q[i] - test->mean[i % (size_t)N]);
            e += d * d, var += c * c;
        }
    }
    fprintf(out, "E_q whole %.5g\n", 100 * sqrt(e / var));
    pod_free(&pod), free(start), free(mean), free(X), free(w);
    return 0;
}
