/* SPDX-License-Identifier: MIT */
/* mechanics.c - learned mass matrix, forces and potential against MuJoCo's. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

enum { EVERY = 97 }; /* samples between the poses that are compared */

/* Poses that the model refuses, a weak one far from what it has seen, are left out; how many: `failed mechanics`, percent. */
static void print_refused(int poses, int compared, FILE *out)
{
    if (compared < poses) fprintf(out, "failed mechanics %.3g\n", 100. * (poses - compared) / poses);
}

/* rms over poses of |a - s b| / |s b|, s = <a, b> / <b, b> if fitted, else 1. */
struct pairs {
    int count, size;
    double *a, *b;
};

static void pairs_open(struct pairs *p, int count, int size)
{
    p->count = 0, p->size = size;
    p->a = calloc((size_t)(count * size), sizeof *p->a), p->b = calloc((size_t)(count * size), sizeof *p->b);
    if (!p->a || !p->b) exit(1);
}

static double factor(const struct pairs *p)
{
    double ab = 0, bb = 0;
    for (int i = 0; i < p->count * p->size; i++)
        ab += p->a[i] * p->b[i], bb += p->b[i] * p->b[i];
    return ab / bb;
}

/* sqrt(sum |a - s b|^2 / sum |s b|^2), of the deviations from their means if centred. */
static double apart(const struct pairs *p, double s, int centred)
{
    double e = 0, v = 0, ma = 0, mb = 0;
    const int n = p->count * p->size;
    for (int i = 0; i < n && centred; i++)
        ma += p->a[i] / n, mb += p->b[i] / n;
    for (int i = 0; i < n; i++) {
        const double b = s * (p->b[i] - mb), d = p->a[i] - ma - b;
        e += d * d, v += b * b;
    }
    return 100 * sqrt(e / v);
}

static void pairs_close(struct pairs *p)
{
    free(p->a), free(p->b);
}

/* q = scale z: M_q = M_z / scale^2, forces f_q = f_z / scale. */
static int pend2(struct model *m, const struct motion *d, FILE *out)
{
    const int poses = (d->count * d->samples + EVERY - 1) / EVERY;
    const double u = (double)m->sc->q;
    const struct config *kind = m->kind;
    struct pairs M, c, g;
    pairs_open(&M, poses, 4), pairs_open(&c, poses, 2), pairs_open(&g, poses, 2);
    for (int i = 0; i < d->count * d->samples; i += EVERY) {
        roln_real s[4], Mz[4], cz[2], gz[2];
        const roln_dynamics_out terms = {.M = Mz, .c = cz, .g = gz};
        double q[2], qd[2];
        for (int j = 0; j < 2; j++)
            q[j] = (double)d->q[2 * i + j], qd[j] = (double)d->qd[2 * i + j];
        if (kind->encode(m->self, d->q + 2 * i, d->qd + 2 * i, s) != ROLN_OK || kind->terms(m->self, s, &terms) != ROLN_OK)
            continue;
        if (truth_terms_pend2(q, qd, M.b + 4 * M.count, c.b + 2 * M.count, g.b + 2 * M.count) != 0) return -1;
        for (int j = 0; j < 4; j++)
            M.a[4 * M.count + j] = (double)Mz[j] / (u * u);
        for (int j = 0; j < 2; j++)
            c.a[2 * M.count + j] = (double)cz[j] / u, g.a[2 * M.count + j] = (double)gz[j] / u;
        c.count = g.count = ++M.count;
    }
    fprintf(out, "error M %.4g\nerror c %.4g\nerror g %.4g\n", apart(&M, 1, 0), apart(&c, 1, 0), apart(&g, 1, 0));
    print_refused(poses, M.count, out);
    pairs_close(&M), pairs_close(&c), pairs_close(&g);
    return 0;
}

/* The true chart of pend16 and wave16 is z* = (q0, q4, q8, q12): with A = dz* / dz, the rows of J = d phi / dz of these joints,
   the true mass in learned coordinates is A^T M* A. Without forces M and V up to one factor, V also up to a constant. */
static int joints16(struct model *m, const struct motion *d, FILE *out)
{
    const int n = m->kind->n, poses = (d->count * d->samples + EVERY - 1) / EVERY;
    const struct config *kind = m->kind;
    struct pairs M, V;
    if (n != 4) return 0;
    pairs_open(&M, poses, 16), pairs_open(&V, poses, 1);
    for (int i = 0; i < d->count * d->samples; i += EVERY) {
        roln_real s[8], q[16], J[16], Mz[16], Vz;
        const roln_dynamics_out terms = {.M = Mz, .V = &Vz};
        double zt[4], Mt[16], Vt, A[16];
        if (kind->encode(m->self, d->q + 16 * i, d->qd + 16 * i, s) != ROLN_OK || kind->terms(m->self, s, &terms) != ROLN_OK)
            continue;
        roln_status st = ROLN_OK;
        for (int k = 0; k < 4 && st == ROLN_OK; k++) {
            for (int j = 0; j < 4; j++)
                s[4 + j] = j == k;
            st = kind->decode(m->self, s, q, J);
            for (int j = 0; j < 4; j++)
                A[4 * j + k] = (double)J[4 * j], zt[j] = (double)q[4 * j];
        }
        if (st != ROLN_OK) continue;
        if (truth_reduced(d->system, zt, Mt, &Vt) != 0) return -1;
        for (int a = 0; a < 4; a++)
            for (int b = 0; b < 4; b++) {
                double sum = 0;
                for (int j = 0; j < 4; j++)
                    for (int k = 0; k < 4; k++)
                        sum += A[4 * j + a] * Mt[4 * j + k] * A[4 * k + b];
                M.b[16 * M.count + 4 * a + b] = sum;
                M.a[16 * M.count + 4 * a + b] = (double)Mz[4 * a + b];
            }
        V.a[V.count] = (double)Vz, V.b[V.count] = Vt;
        V.count = ++M.count;
    }
    const double s = d->tau ? 1 : factor(&M);
    fprintf(out, "error M %.4g\nerror V %.4g\n", apart(&M, s, 0), apart(&V, s, 1));
    print_refused(poses, M.count, out);
    pairs_close(&M), pairs_close(&V);
    return 0;
}

int mechanics(struct model *m, const struct motion *d, FILE *out)
{
    if (d->system == TRUTH_PEND2_ACT) return pend2(m, d, out);
    const int known = d->system == TRUTH_PEND16 || d->system == TRUTH_PEND16_PD || d->system == TRUTH_WAVE16;
    return known && m->kind->md->ae.layers > 0 ? joints16(m, d, out) : 0;
}
