/* SPDX-License-Identifier: MIT */
/* model.c - models by their struct config: their start, the way back from POD coordinates, files, and what a predictor is. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"

static void *room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (!p) fprintf(stderr, "model: out of memory\n"), exit(1);
    return p;
}

/* The numbers of a model in its memory. */
static void point(struct model *m)
{
    char *self = m->self;
    m->sc = (roln_scale *)(void *)(self + m->kind->scale);
    m->dt = (roln_real *)(void *)(self + m->kind->dt);
    m->theta = (roln_real *)(void *)(self + m->kind->theta);
}

/* Numbers that the kind knows: of the config slope and least, which stand first, and scales 1. */
static void build(struct model *m, const struct config *kind)
{
    memset(m, 0, sizeof *m);
    m->kind = kind, m->self = room(1, kind->size);
    roln_real *p = m->self;
    point(m);
    p[0] = kind->md->ae.slope, p[1] = kind->md->lnn.eigenvalue_floor;
    m->sc->q = m->sc->t = m->sc->m = 1;
}

int model_front(const struct config *kind)
{
    int blocks = 0;
    for (int at = 0; at < kind->front; blocks++)
        at += roln_block_size(kind->table + blocks);
    return blocks;
}

void model_restart(struct model *m, double zoom, uint64_t seed)
{
    const roln_lnn *f = &m->kind->md->lnn;
    roln_real *mass = m->theta + m->kind->front;
    roln_lnn_init(f, mass, &seed);
    /* z of a chart is in [-1, 1]; networks that see z / zoom, with M = I / zoom^2, keep T of order one */
    roln_lnn_steepen(f, m->kind->md->ae.monomials > 0 ? 4 : 1 / (roln_real)zoom, mass);
    for (int i = 0; i < f->n && f->mass == ROLN_EXPONENTIAL; i++)
        mass[rolni_potential_at(f) - ROLN_TRI(f->n) + i] = (roln_real)(-2 * log(zoom));
}

int model_init(struct model *m, const struct config *kind, double zoom, const struct motion *d, uint64_t seed)
{
    build(m, kind);
    const roln_status st = kind->init(m->self, d->count * d->samples, d->q, d->qd, zoom, seed);
    if (st == ROLN_OK) model_restart(m, zoom, seed);
    else fprintf(stderr, "model: no start from this data, status %d\n", (int)st);
    return st == ROLN_OK ? 0 : -1;
}

void model_copy(struct model *to, const struct model *from)
{
    *to = *from;
    to->newton = NULL, to->self = room(1, from->kind->size);
    memcpy(to->self, from->self, from->kind->size);
    point(to);
}

void model_free(struct model *m)
{
    newton_free(m->newton);
    free(m->self);
    memset(m, 0, sizeof *m);
}

/* ---- back from POD coordinates ---- */

/* x = q / scale of the whole model, y = W^T (q - mean) / scale that of the small one. Before a chart a layer of its own, whose
   activation must be the identity: Phi = Psi = W, b = mean / scale. A layered autoencoder needs none: its first encoder layer
   sees Psi^T (y - b) = (W Psi)^T (x - (mean / scale + W b)), its decoder gives Phi u + b; W Phi and W Psi are biorthogonal again,
   for W^T W = I. */
static void compose(struct model *b, const struct model *a, const struct pod *p, const roln_real *mean)
{
    const roln_ae *ae = &a->kind->md->ae;
    const int N = p->N, r = p->r, rows = ae->monomials > 0 ? 2 * r : 2 * ae->size[1];
    const roln_real *from = a->theta + (ae->monomials > 0 ? 0 : rows * r + r), *bias = a->theta + rows * r;
    for (int k = 0; k < rows; k++) /* Phi^T, then Psi^T */
        for (int j = 0; j < N; j++) {
            double sum = 0;
            for (int i = 0; i < r; i++)
                sum += (ae->monomials > 0 ? k % r == i : (double)a->theta[k * r + i]) * p->W[j * r + i];
            b->theta[k * N + j] = (roln_real)sum;
        }
    for (int j = 0; j < N; j++) {
        double sum = (double)(mean[j] / a->sc->q);
        for (int i = 0; i < r && ae->monomials == 0; i++)
            sum += (double)bias[i] * p->W[j * r + i];
        b->theta[rows * N + j] = (roln_real)sum;
    }
    memcpy(b->theta + rows * N + N, from, (size_t)(a->theta + a->kind->params - from) * sizeof *b->theta);
}

int model_compose(struct model *b, const struct model *a, const struct config *whole, const struct pod *p, const roln_real *mean)
{
    const roln_ae *small = &a->kind->md->ae;
    if (small->layers < 1 || small->size[0] != p->r || (small->monomials > 0 && !(small->slope >= 1)) || whole->N != p->N)
        return -1;
    build(b, whole);
    *b->sc = *a->sc, *b->dt = *a->dt;
    compose(b, a, p, mean);
    return 0;
}

/* ---- files: the library's packed bytes ---- */

int model_save(const struct model *m, const char *path)
{
    const size_t size = (size_t)m->kind->packed;
    unsigned char *bytes = room(size, 1);
    FILE *f = fopen(path, "wb");
    int bad = !f;
    m->kind->pack(m->self, bytes);
    if (f) bad = fwrite(bytes, 1, size, f) != size, bad |= fclose(f) != 0;
    if (bad) perror(path);
    free(bytes);
    return bad ? -1 : 0;
}

int model_load(struct model *m, const struct config *kind, const char *path)
{
    const size_t size = (size_t)kind->packed;
    unsigned char *bytes = room(size + 1, 1);
    FILE *f = fopen(path, "rb");
    const int count = f ? (int)fread(bytes, 1, size + 1, f) : 0;
    if (f) fclose(f);
    build(m, kind);
    const roln_status st = kind->open(m->self, count, bytes);
    if (st != ROLN_OK) fprintf(stderr, "%s: status %d\n", path, (int)st);
    free(bytes);
    return st == ROLN_OK ? 0 : -1;
}

roln_status model_quantise(struct model *to, const struct config *kind, const struct model *from)
{
    unsigned char *bytes = room((size_t)from->kind->packed, 1);
    from->kind->pack(from->self, bytes);
    build(to, kind);
    const roln_status st = kind->open(to->self, from->kind->packed, bytes);
    free(bytes);
    return st;
}

/* ---- as a predictor ---- */

roln_status model_encode(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    const struct model *m = self;
    return m->kind->encode(m->self, q, qd, s);
}

static roln_status step(void *self, roln_real *s, const roln_real *tau, double h)
{
    const struct model *m = self;
    return m->kind->step(m->self, s, tau, h);
}

roln_status model_decode(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    const struct model *m = self;
    return m->kind->decode(m->self, s, q, qd);
}

roln_status model_latent(struct model *m, const roln_real *q, const roln_real *qd, const roln_real *qdd, const roln_real *tau,
                         roln_real *z, roln_real *tau_z)
{
    const int n = m->kind->n;
    const roln_real t = m->sc->t;
    roln_status st = qdd ? m->kind->encode_reference(m->self, q, qd, qdd, z) : m->kind->encode(m->self, q, qd, z);
    if (st == ROLN_OK && tau) st = m->kind->reduce(m->self, z, tau, tau_z);
    for (int i = 0; i < n; i++) {
        z[n + i] *= t;
        if (qdd) z[2 * n + i] *= t * t;
        if (tau) tau_z[i] *= t * t;
    }
    return st;
}

void model_lift(struct model *m, const roln_real *z, roln_real *qdd)
{
    m->kind->jets(m->self, z, qdd);
}

static roln_status accelerate(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd)
{
    struct model *m = self;
    roln_real z[3 * LATENT_MOST], tau_z[LATENT_MOST];
    roln_status st = model_latent(m, q, qd, NULL, tau, z, tau_z);
    if (st == ROLN_OK) st = m->kind->zdd(m->self, z, tau ? tau_z : NULL, z + 2 * m->kind->n);
    if (st == ROLN_OK) model_lift(m, z, qdd);
    return st;
}

static void energy(void *self, const roln_real *s, double *T, double *V)
{
    const struct model *m = self;
    roln_real kinetic = 0, potential = 0;
    const roln_dynamics_out out = {.T = &kinetic, .V = &potential};
    m->kind->terms(m->self, s, &out);
    *T = (double)kinetic, *V = (double)potential;
}

struct predictor model_predictor(struct model *m)
{
    const struct predictor p = {
        m->kind->N, 2 * m->kind->n, m, model_encode, step, model_decode, accelerate, m->kind->md->lnn.damping ? NULL : energy};
    return p;
}
