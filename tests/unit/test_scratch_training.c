/* SPDX-License-Identifier: MIT */
/* Scratch of training is exact: the hungriest call of every function writes all of the scratch that its type declares. */
#define CALLED(X) X(fit_limits) X(fit_noise) X(variance) X(fit_inertia) X(force_variance) X(errors) X(grad) X(grad_acc)
#include "small.h"
#include "scratch.h"
#include "samples.h"

void TEST_NAME(scratch_training)(void);

/* Limits and noise of a recording. */
static void use_recording(int k, const instance *m, const roln_real *x)
{
    const int N = N_OF(k);
    const roln_batch b = {1, 1, 1, NULL, x, x + 2 * N, NULL, x};
    const roln_batch positions = {1, 1, 1, NULL, x, NULL, NULL, x};
    roln_limits limits = {.dt = dt, .evidence = all_known()};
    roln_noise noise = {.dt = dt, .q = 1, .tau = 1, .load = 1};
    roln_real each[MAXN], rates[MAXN];
    USE(fit_limits, m->of->fit_limits(m, &b, 1, &limits, each, rates, work));
    USE(fit_noise, m->of->fit_noise(m, &positions, &noise, each, NULL, work));
}

static const roln_opt adam_options = {.lr = {ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)},
                                      .beta1 = ROLN_C(0.9), .beta2 = ROLN_C(0.999), .eps = ROLN_C(1e-8), .clip = 5};

enum { MAXE = 10 };
static void use_training(int k, const instance *m, roln_real *theta, uint64_t *s)
{
    static data d;
    static roln_real g[GRADIENT_SIZE(MAXP)], m1[MAXP], v[MAXP], v_max[MAXP];
    const int block = models[k]->block;
    const roln_moments moments = {m1, v, v_max};
    roln_adam adam = {0, 0, 0};
    roln_real qbar[MAXN] = {0}, unit_of_it, forces[MAXN];
    roln_error e[MAXE];
    roln_loss var;
    int kind, force, i;
    memset(g, 0, sizeof g), fill(MAXP, 0, m1), fill(MAXP, 0, v), fill(MAXP, 0, v_max);
    for (kind = 0; kind < KINDS; kind += 2)
        for (force = 0; force < 2; force++) {
            make(k, kind, block, s, &d);
            d.h = dt / 16;
            for (i = 0; i < MAXD && k == DEEP; i++) /* which multiplies by a thousand */
                d.q[i] /= 64, d.qd[i] /= 64, d.tau[i] /= 4096;
            if (!force) d.b.tau = NULL;
            if (is_acc(kind)) USE(grad_acc, m->of->grad_acc(m, &weights.loss, &d.b, g, work));
            else USE(grad, m->of->grad(m, &weights.loss, &d.b, d.h, g, work));
            if (block > 1) USE(variance, m->of->variance(m, &d.b, &var, work));
            if (kind == ODE) USE(errors, m->of->errors(m, &d.b, d.h, 1, qbar, &(roln_errors){e, NULL, NULL}, work));
        }
    make(k, ACC, 4, s, &d); /* of more than one window */
    USE(variance, m->of->variance(m, &d.b, &var, work));
    USE(fit_inertia, m->of->fit_inertia(m, &d.b, &unit_of_it, work));
    used.force_variance = used.fit_inertia; /* a model with inputs has none */
    if (m->of->md->inputs == 0) USE(force_variance, m->of->force_variance(m, &d.b, forces, work));
    USE(update, roln_adam_update(models[k]->blocks, models[k]->table, &adam_options, 1 / g[models[k]->params + TERMS], g, theta,
                                 &adam, &moments, work));
    USE(init, roln_ae_init(&m->of->md->ae, theta, s, work));
}

#define TRAINS(X) \
    X(fit_limits) X(fit_noise) X(variance) X(fit_inertia) X(force_variance) X(errors) X(grad) X(grad_acc) X(update) X(init)

void TEST_NAME(scratch_training)(void)
{
    static roln_real theta[MAXP], x[256];
    roln_real low[MAXN], high[MAXN];
    int k;
    fill(MAXN, -100, low), fill(MAXN, 100, high);
    for (k = 0; k < MODELS; k++) {
        const instance m = {models[k], scale_of(k), low, high, high, theta, NULL};
        uint64_t s = scratch_start(k, theta, x);
        use_recording(k, &m, x);
        use_training(k, &m, theta, &s);
        TRAINS(CHECK_EXACT)
    }
}
