/* SPDX-License-Identifier: MIT */
/* model.c - RO-LNN and its relatives at run-time sizes: what the typed shell of roln.h does at compile time, and the way back
   from POD coordinates. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"
#include "sizes.h"

static void *room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (!p) fprintf(stderr, "model: out of memory\n"), exit(1);
    return p;
}

roln_trained model_trained(const struct model *m)
{
    const roln_trained t = {.model = &m->md, .scale = &m->sc, .theta = m->theta};
    return t;
}

/* Scratch of one function of the predictor at a time. */
static int predictor_work(const roln_model *md)
{
    const struct sizes sz = sizes_of(md, 1);
    const int sizes[] = {ROLN_ENCODE_WORK(SZ, 3),
                         ROLN_DECODE_WORK(SZ),
                         ROLN_REDUCE_WORK(SZ),
                         ROLN_STEP_WORK(SZ),
                         ROLN_TERMS_WORK(SZ),
                         ROLN_FIT_RANGE_WORK(SZ),
                         3 * sz.N + ROLN_AE_DECODE_TAPE(SZ, 3, 1),
                         ROLN_LNN_TAPE(SZ, 1, 0, 1) + ROLN_LNN_ZDD_WORK(SZ, 0, 1)};
    int most = 0;
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++)
        most = ROLN_MAX(most, sizes[i]);
    return most;
}

static void put_block(struct model *m, const roln_manifold *manifold, int rows, int cols, int group)
{
    const roln_block b = {manifold, rows, cols, group};
    m->table[m->blocks++] = b;
}

static roln_mlp mlp(int n, int hidden, int out)
{
    const roln_mlp f = {3, {n, hidden, hidden, out}};
    return f;
}

/* Sizes, manifold and memory of a model. */
static void build(struct model *m, const struct shape *s)
{
    roln_ae *ae = &m->md.ae;
    roln_lnn *f = &m->md.lnn;
    memset(m, 0, sizeof *m);
    for (ae->size[0] = s->ae[0]; ae->layers < ROLN_AE_MAX && s->ae[ae->layers + 1] > 0; ae->layers++)
        ae->size[ae->layers + 1] = s->ae[ae->layers + 1];
    ae->slope = (roln_real)s->slope;
    if (s->degree > 0) {
        ae->bend = &roln_polynomial, ae->degree = s->degree;
        ae->curves = ROLN_CURVES(ae->size[ae->layers], s->degree);
    }
    f->n = ae->size[ae->layers];
    f->mass = s->mass, f->base = s->base, f->damping = s->damping, f->least = ROLN_C(1e-4);
    f->layers = s->layers;
    f->mass_net = f->damper_net = mlp(f->n, s->mlp, ROLN_TRI(f->n)), f->potential_net = mlp(f->n, s->mlp, 1);
    m->md.scheme = ROLN_RK4;
    m->params = roln_params(&m->md);
    for (int l = 0; l < ae->layers; l++) {
        put_block(m, &roln_biorthogonal, ae->size[l + 1], ae->size[l], 0);
        put_block(m, ROLN_EUCLIDEAN, 1, ae->size[l], 2);
    }
    put_block(m, ROLN_EUCLIDEAN, ae->curves, roln_ae_bent(ae), 2);
    m->front = m->blocks;
    put_block(m, ROLN_EUCLIDEAN, 1, rolni_base_at(f), 1);
    if (f->base) put_block(m, &roln_spd, f->n, f->n, 1);
    for (int i = 0; i < f->layers; i++) {
        put_block(m, ROLN_EUCLIDEAN, 1, ROLN_TRI(f->n), 1);
        put_block(m, &roln_spd, f->n, f->n, 1);
    }
    m->theta = room((size_t)m->params, sizeof *m->theta);
    m->work = room((size_t)predictor_work(&m->md), sizeof *m->work);
}

void model_restart(struct model *m, const struct shape *shape, uint64_t seed)
{
    const roln_lnn *f = &m->md.lnn;
    roln_real *mass = m->theta + roln_ae_params(&m->md.ae);
    roln_lnn_init(f, mass, &seed);
    /* z of a chart is in [-1, 1]; networks that see z / zoom, with M = I / zoom^2, keep T of order one */
    roln_lnn_steepen(f, m->md.ae.curves > 0 ? 4 : 1 / (roln_real)shape->zoom, mass);
    for (int i = 0; i < f->n && f->mass == ROLN_EXPONENTIAL; i++)
        mass[rolni_potential_at(f) - ROLN_TRI(f->n) + i] = (roln_real)(-2 * log(shape->zoom));
}

int model_init(struct model *m, const struct shape *shape, const struct motion *d, uint64_t seed)
{
    const int rows = d->count * d->samples;
    build(m, shape);
    const struct sizes sz = sizes_of(&m->md, 1);
    roln_real *qbar = room((size_t)d->N, sizeof *qbar), *work = room((size_t)ROLN_AE_POD_WORK(SZ), sizeof *work);
    double *sums = room((size_t)ROLN_AE_POD_ROOM(SZ) + 1, sizeof *sums);
    roln_status st = roln_fit_scale(&m->md, rows, d->q, d->qd, qbar, &m->sc, NULL);
    m->sc.q /= (roln_real)shape->zoom;
    if (st == ROLN_OK) st = roln_ae_init_pod(&m->md.ae, rows, d->q, 1 / m->sc.q, NULL, m->theta, sums, work);
    if (st == ROLN_OK) model_restart(m, shape, seed);
    else fprintf(stderr, "model: no start from this data, status %d\n", (int)st);
    free(qbar), free(work), free(sums);
    return st == ROLN_OK ? 0 : -1;
}

void model_free(struct model *m)
{
    newton_free(m->newton);
    free(m->theta), free(m->work);
    memset(m, 0, sizeof *m);
}

/* ---- back from POD coordinates ---- */

/* x = q / scale of the full model, y = W^T (q - mean) / scale that of the small one. Before a chart a layer of its own, whose
   activation must be the identity: Phi = Psi = W, b = mean / scale. A layered autoencoder needs none: its first encoder layer
   sees Psi^T (y - b) = (W Psi)^T (x - (mean / scale + W b)), its decoder gives Phi u + b; W Phi and W Psi are biorthogonal again,
   for W^T W = I. */
static void compose(struct model *b, const struct model *a, const struct pod *p, const roln_real *mean)
{
    const int N = p->N, r = p->r, rows = a->md.ae.curves > 0 ? 2 * r : 2 * a->md.ae.size[1];
    const roln_real *from = a->theta + (a->md.ae.curves > 0 ? 0 : rows * r + r), *bias = a->theta + rows * r;
    for (int k = 0; k < rows; k++) /* Phi^T, then Psi^T */
        for (int j = 0; j < N; j++) {
            double sum = 0;
            for (int i = 0; i < r; i++)
                sum += (a->md.ae.curves > 0 ? k % r == i : (double)a->theta[k * r + i]) * p->W[j * r + i];
            b->theta[k * N + j] = (roln_real)sum;
        }
    for (int j = 0; j < N; j++) {
        double sum = (double)(mean[j] / a->sc.q);
        for (int i = 0; i < r && a->md.ae.curves == 0; i++)
            sum += (double)bias[i] * p->W[j * r + i];
        b->theta[rows * N + j] = (roln_real)sum;
    }
    memcpy(b->theta + rows * N + N, from, (size_t)(a->theta + a->params - from) * sizeof *b->theta);
}

int model_compose(struct model *b, const struct model *a, const struct shape *shape, const struct pod *p, const roln_real *mean)
{
    const roln_ae *small = &a->md.ae;
    if (small->layers < 1 || small->size[0] != p->r || (small->curves > 0 && !(small->slope >= 1))) return -1;
    const struct shape full = model_full_shape(shape, p->N);
    build(b, &full);
    b->sc = a->sc, b->dt = a->dt;
    compose(b, a, p, mean);
    return 0;
}

struct shape model_full_shape(const struct shape *shape, int N)
{
    struct shape full = *shape;
    for (int l = ROLN_AE_MAX; l > 0 && shape->degree > 0; l--)
        full.ae[l] = shape->ae[l - 1];
    full.ae[0] = N;
    return full;
}

/* ---- files: the library's packed bytes ---- */

static int packed(const struct model *m)
{
    return ROLN_PACKED(m->md.ae.layers, m->md.lnn.mass_net.layers, m->md.lnn.layers, m->md.lnn.angles, 0,
                       m->md.lnn.n, m->params);
}

/* Numbers of a packed model, which has no range: slope, least, scales, dt, 3 n zeros, theta. */
static roln_real *numbers_of(const struct model *m)
{
    return room((size_t)ROLN_NUMBERS(0, m->md.lnn.n, m->params), sizeof(roln_real));
}

int model_save(const struct model *m, const char *path)
{
    roln_real *x = numbers_of(m);
    unsigned char *bytes = room((size_t)packed(m), 1);
    FILE *f = fopen(path, "wb");
    int bad = !f;
    x[0] = m->md.ae.slope, x[1] = m->md.lnn.least, x[2] = m->sc.q, x[3] = m->sc.t, x[4] = m->sc.m, x[5] = m->dt;
    memcpy(x + ROLN_NUMBERS(0, m->md.lnn.n, 0), m->theta, (size_t)m->params * sizeof *x);
    roln_pack(&m->md, x, bytes);
    if (f) bad = fwrite(bytes, 1, (size_t)packed(m), f) != (size_t)packed(m), bad |= fclose(f) != 0;
    if (bad) perror(path);
    free(x), free(bytes);
    return bad ? -1 : 0;
}

int model_load(struct model *m, const struct shape *shape, const char *path)
{
    build(m, shape);
    const int size = packed(m);
    roln_real *x = numbers_of(m);
    unsigned char *bytes = room((size_t)size + 1, 1);
    FILE *f = fopen(path, "rb");
    const int count = f ? (int)fread(bytes, 1, (size_t)size + 1, f) : 0;
    if (f) fclose(f);
    const roln_status st = roln_unpack(&m->md, count, bytes, x);
    if (st != ROLN_OK) fprintf(stderr, "%s: status %d\n", path, (int)st);
    else {
        m->sc.q = x[2], m->sc.t = x[3], m->sc.m = x[4], m->dt = x[5];
        memcpy(m->theta, x + ROLN_NUMBERS(0, m->md.lnn.n, 0), (size_t)m->params * sizeof *x);
    }
    free(x), free(bytes);
    return st == ROLN_OK ? 0 : -1;
}

/* ---- as a predictor ---- */

roln_status model_encode(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    struct model *m = self;
    const roln_trained t = model_trained(m);
    return roln_encode(&t, q, qd, NULL, s, s + m->md.lnn.n, NULL, m->work);
}

static roln_status step(void *self, roln_real *s, const roln_real *tau, double h)
{
    struct model *m = self;
    const roln_trained t = model_trained(m);
    return roln_step(&t, s, s + m->md.lnn.n, tau, (roln_real)h, m->work);
}

roln_status model_decode(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    struct model *m = self;
    const roln_trained t = model_trained(m);
    return roln_decode(&t, s, s + m->md.lnn.n, q, qd, m->work);
}

roln_status model_latent(struct model *m, const roln_real *q, const roln_real *qd, const roln_real *qdd, const roln_real *tau,
                         roln_real *z, roln_real *tau_z)
{
    const int n = m->md.lnn.n;
    const roln_real t = m->sc.t;
    const roln_trained self = model_trained(m);
    roln_status st = roln_encode(&self, q, qd, qdd, z, z + n, qdd ? z + 2 * n : NULL, m->work);
    if (st == ROLN_OK && tau) st = roln_reduce(&self, z, tau, tau_z, m->work);
    for (int i = 0; i < n; i++) {
        z[n + i] *= t;
        if (qdd) z[2 * n + i] *= t * t;
        if (tau) tau_z[i] *= t * t;
    }
    return st;
}

void model_lift(struct model *m, const roln_real *z, roln_real *qdd)
{
    const int N = m->md.ae.size[0];
    roln_real *x = m->work, *work = x + 3 * N;
    roln_ae_decode(&m->md.ae, 3, 1, m->theta, z, x, work);
    for (int i = 0; i < N; i++)
        qdd[i] = x[2 * N + i] * (m->sc.q / (m->sc.t * m->sc.t));
}

static roln_status accelerate(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd)
{
    struct model *m = self;
    const int n = m->md.lnn.n;
    roln_real z[3 * LATENT_MOST], tau_z[LATENT_MOST];
    roln_status st = model_latent(m, q, qd, NULL, tau, z, tau_z);
    if (st == ROLN_OK)
        st = roln_lnn_zdd(&m->md.lnn, 0, 1, m->theta + roln_ae_params(&m->md.ae), z, tau ? tau_z : NULL, z + 2 * n, m->work,
                          m->work + roln_lnn_tape(&m->md.lnn, 1, 0, 1));
    if (st == ROLN_OK) model_lift(m, z, qdd);
    return st;
}

static void energy(void *self, const roln_real *s, double *T, double *V)
{
    struct model *m = self;
    roln_real kinetic = 0, potential = 0;
    const roln_trained t = model_trained(m);
    const roln_terms_out out = {.T = &kinetic, .V = &potential};
    roln_terms(&t, s, s + m->md.lnn.n, &out, m->work);
    *T = (double)kinetic, *V = (double)potential;
}

struct predictor model_predictor(struct model *m)
{
    const struct predictor p = {
        m->md.ae.size[0], 2 * m->md.lnn.n, m, model_encode, step, model_decode, accelerate, m->md.lnn.damping ? NULL : energy};
    return p;
}
