/* baseline.c - the models of latent.c under the autoencoder of a trained model. */
#include <stdlib.h>

#include "experiment.h"

int baseline_train(struct baseline *b, enum latent_kind kind, const struct motion *d, const struct stage *stage, uint64_t seed,
                   double *samples)
{
    struct model *m = b->model;
    const int n = m->md.lnn.n, rows = d->count * d->samples;
    const size_t total = (size_t)rows * (size_t)n;
    roln_real *z = malloc(4 * total * sizeof *z), x[3 * LATENT_MOST], f[LATENT_MOST];
    int count = 0, bad = !z;
    for (int i = 0; i < rows && !bad; i++) {
        const size_t row = (size_t)i * (size_t)d->N, at = (size_t)count * (size_t)n;
        if (i % d->samples == 0 || (i + 1) % d->samples == 0) continue; /* no central difference */
        bad = model_latent(m, d->q + row, d->qd + row, d->qdd + row, d->tau ? d->tau_mid + row : NULL, x, f) != ROLN_OK;
        for (int k = 0; k < 3; k++)
            memcpy(z + (size_t)k * total + at, x + k * n, (size_t)n * sizeof *z);
        if (d->tau) memcpy(z + 3 * total + at, f, (size_t)n * sizeof *z);
        count++;
    }
    const struct latent_data data = {count, n, z, z + total, z + 2 * total, d->tau ? z + 3 * total : NULL};
    bad = bad || latent_train(&b->latent, kind, &data, stage->updates, stage->batch, stage->lr_net, seed) != 0;
    *samples += (double)stage->updates * stage->batch;
    free(z);
    return bad ? -1 : 0;
}

/* RK4 in the model's unit of time. */
static roln_status step(void *self, roln_real *s, const roln_real *tau, double dt)
{
    static const double c[4] = {0, .5, .5, 1}, w[4] = {1. / 6, 1. / 3, 1. / 3, 1. / 6};
    const struct baseline *b = self;
    struct model *m = b->model;
    const int n = m->md.lnn.n;
    const roln_trained reduced = model_trained(m);
    const roln_real t = m->sc.t, h = (roln_real)dt / t;
    roln_real k[2 * LATENT_MOST] = {0}, x[2 * LATENT_MOST], y[2 * LATENT_MOST], tau_z[LATENT_MOST];
    for (int i = 0; i < 2 * n; i++)
        y[i] = s[i] *= i < n ? 1 : t;
    for (int j = 0; j < 4; j++) {
        for (int i = 0; i < 2 * n; i++)
            x[i] = s[i] + (roln_real)c[j] * h * k[i];
        roln_status st = tau ? roln_reduce(&reduced, x, tau, tau_z, m->work) : ROLN_OK;
        for (int i = 0; i < n && tau; i++)
            tau_z[i] *= t * t;
        if (st == ROLN_OK) st = latent_rate(b->latent, x, tau ? tau_z : NULL, k);
        if (st != ROLN_OK) return st;
        for (int i = 0; i < 2 * n; i++)
            y[i] += (roln_real)w[j] * h * k[i];
    }
    for (int i = 0; i < 2 * n; i++)
        s[i] = i < n ? y[i] : y[i] / t;
    return roln_all_finite(2 * n, s) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

static roln_status encode(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    return model_encode(((struct baseline *)self)->model, q, qd, s);
}

static roln_status decode(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    return model_decode(((struct baseline *)self)->model, s, q, qd);
}

static roln_status accelerate(void *self, const roln_real *q, const roln_real *qd, const roln_real *tau, roln_real *qdd)
{
    const struct baseline *b = self;
    const int n = b->model->md.lnn.n;
    roln_real z[3 * LATENT_MOST], rate[2 * LATENT_MOST], tau_z[LATENT_MOST];
    roln_status st = model_latent(b->model, q, qd, NULL, tau, z, tau_z);
    if (st == ROLN_OK) st = latent_rate(b->latent, z, tau ? tau_z : NULL, rate);
    if (st != ROLN_OK) return st;
    memcpy(z + 2 * n, rate + n, (size_t)n * sizeof *z);
    model_lift(b->model, z, qdd);
    return ROLN_OK;
}

struct predictor baseline_predictor(struct baseline *b)
{
    const struct predictor p = {b->model->md.ae.size[0], 2 * b->model->md.lnn.n, b, encode, step, decode, accelerate, NULL};
    return p;
}
