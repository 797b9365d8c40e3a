/* SPDX-License-Identifier: MIT */
/* on_model.h - a model and its struct config, MODEL_kind, included for each behind MODEL, its name, MODEL_AE, its sizes, and
   MODEL_LEARNS: has it functions of training? All other options are those of CONFIG. */
#define ROLN_NAME MODEL
#define ROLN_AE MODEL_AE
#define ROLN_CHART COLUMN(CHART_OF)
#define ROLN_ANGLES COLUMN(ANGLES_OF)
#if ROLNI_AT(1, COLUMN(HEAD_OF)) > 0
#define ROLN_POLYNOMIALS COLUMN(HEAD_OF)
#else
#define ROLN_MLP COLUMN(HEAD_OF), COLUMN(HEAD_OF)
#endif
#define ROLN_SLOPE COLUMN(SLOPE_OF)
#define ROLN_MASS COLUMN(MASS_OF)
#define ROLN_BASE COLUMN(BASE_OF)
#define ROLN_LAYERS COLUMN(LAYERS_OF)
#define ROLN_DAMPING COLUMN(DAMPING_OF)
#define ROLN_QUANTISE COLUMN(STORE_OF)
#define ROLN_HORIZON 25
#if MODEL_LEARNS
#define ROLN_GN_ROWS 1
#endif
#include "roln.h"

#undef M
#define M(x) ROLNI_CAT(MODEL, x)

typedef struct {
    M(params) p;
#if MODEL_LEARNS
    M(gradient) g;
    M(optimiser) o;
    M(residuals) row;
#endif
    union {
        M(work) work;
        M(train) train;
        M(start) start;
        struct { roln_real x[3 * M(N)], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(M, 3, 1))]; } jets;
        struct { roln_real tape[ROLN_LNN_TAPE(M, 1, 0, 1)], work[ROLN_LNN_ZDD_WORK(M, 0, 1)]; } zdd;
        struct {
            roln_real s[2 * BLOCK * M(n)], tau[BLOCK * M(N)], force[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(M, 1, BLOCK))];
            roln_real reduce[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(M, BLOCK))], tape[ROLN_LNN_TAPE(M, 1, 0, BLOCK)];
            roln_real work[ROLN_LNN_STEP_WORK(M, ROLN_RK4, 0, BLOCK)];
        } block;
    } u;
} M(self);

/* ---- prediction ---- */

static roln_status M(encode_of)(void *self, const roln_real *q, const roln_real *qd, roln_real *s)
{
    M(self) *m = self;
    M(state) x;
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    return M(encode)(&m->p, &x, (M(latent) *)(void *)s, &m->u.work.encode);
}

static roln_status M(reference_of)(void *self, const roln_real *q, const roln_real *qd, const roln_real *qdd, roln_real *z)
{
    M(self) *m = self;
    M(target) r;
    const roln_status st = M(encode_reference)(&m->p, q, qd, qdd, &r, &m->u.work.encode_reference);
    if (st != ROLN_OK) return st;
    memcpy(z, r.z, sizeof r.z), memcpy(z + M(n), r.zd, sizeof r.zd), memcpy(z + 2 * M(n), r.zdd, sizeof r.zdd);
    return ROLN_OK;
}

static roln_status M(decode_of)(void *self, const roln_real *s, roln_real *q, roln_real *qd)
{
    M(self) *m = self;
    M(state) x;
    const roln_status st = M(decode)(&m->p, (const M(latent) *)(const void *)s, &x, &m->u.work.decode);
    if (st == ROLN_OK) memcpy(q, x.q, sizeof x.q), memcpy(qd, x.qd, sizeof x.qd);
    return st;
}

static roln_status M(step_of)(void *self, roln_real *s, const roln_real *tau, double h)
{
    M(self) *m = self;
    return M(step)(&m->p, (M(latent) *)(void *)s, tau, (roln_real)h, &m->u.work.step);
}

static roln_status M(reduce_of)(void *self, const roln_real *z, const roln_real *tau, roln_real *tau_z)
{
    M(self) *m = self;
    M(latent) s;
    memcpy(s.z, z, sizeof s.z), memset(s.zd, 0, sizeof s.zd);
    return M(reduce)(&m->p, &s, tau, tau_z, &m->u.work.reduce);
}

static roln_status M(terms_of)(void *self, const roln_real *s, const roln_dynamics_out *out)
{
    M(self) *m = self;
    M(equation) e;
    const roln_status st = M(dynamics)(&m->p, (const M(latent) *)(const void *)s, &e, &m->u.work.dynamics);
    if (st != ROLN_OK) return st;
    if (out->M) memcpy(out->M, e.M, sizeof e.M);
    if (out->c) memcpy(out->c, e.c, sizeof e.c);
    if (out->g) memcpy(out->g, e.g, sizeof e.g);
    if (out->T) *out->T = e.T;
    if (out->V) *out->V = e.V;
    return ROLN_OK;
}

static void M(jets_of)(void *self, const roln_real *z, roln_real *qdd)
{
    M(self) *m = self;
    const roln_scale *sc = &m->p.scale;
    roln_ae_decode(&M(model).ae, 3, 1, m->p.theta, z, m->u.jets.x, m->u.jets.tape);
    for (int i = 0; i < M(N); i++)
        qdd[i] = m->u.jets.x[2 * M(N) + i] * (sc->q / (sc->t * sc->t));
}

static roln_status M(zdd_of)(void *self, const roln_real *s, const roln_real *tau_z, roln_real *zdd)
{
    M(self) *m = self;
    return roln_lnn_zdd(&M(model).lnn, 0, 1, m->p.theta + M(ae_size), s, tau_z, zdd, m->u.zdd.tape, m->u.zdd.work);
}

static roln_status M(errors_of)(void *self, const roln_batch *b, double dt, int every, const roln_real *qbar, roln_error *e)
{
    M(self) *m = self;
    return M(errors)(&m->p, b, (roln_real)dt, every, qbar, &(roln_errors){e, NULL, NULL}, &m->u.train.errors);
}

/* As NAME_errors rolls out. */
static void M(block_of)(void *self, const roln_real *s0, const roln_real *tau, double dt, int steps)
{
    M(self) *m = self;
    const roln_real t = m->p.scale.t;
    M(i_forced) d;
    M(i_hold_force)(&m->p, tau, m->u.block.tau, m->u.block.force, m->u.block.reduce, &d);
    memcpy(m->u.block.s, s0, sizeof m->u.block.s);
    for (int i = 0; i < steps; i++)
        roln_lnn_step(&M(model).lnn, &d.sys, ROLN_RK4, 0, BLOCK, (roln_real)dt / t, m->u.block.s, m->u.block.s, m->u.block.tape,
                      m->u.block.work);
}

/* ---- files ---- */

#if ROLNI_BITS(COLUMN(STORE_OF)) == 0
static roln_status M(range_of)(void *self, int count, const roln_real *q, const roln_real *qd)
{
    M(self) *m = self;
    return M(fit_range)(&m->p, count, q, qd, &m->u.train.fit_range);
}
#define MODEL_OPEN(count, bytes, m) M(unpack)(count, bytes, &(m)->p)
#else
#define MODEL_OPEN(count, bytes, m) M(quantise)(count, bytes, &(m)->p, &(m)->u.start.quantise)
#endif

static void M(pack_of)(const void *self, unsigned char *bytes)
{
    const M(self) *m = self;
    M(pack)(&m->p, bytes);
}

static roln_status M(open_of)(void *self, int count, const unsigned char *bytes)
{
    M(self) *m = self;
    return MODEL_OPEN(count, bytes, m);
}
#undef MODEL_OPEN

/* ---- training ---- */

#if MODEL_LEARNS
/* The POD of data that are scaled to `zoom` times their usual size. */
static roln_status M(init_of)(void *self, int count, const roln_real *q, const roln_real *qd, double zoom, uint64_t seed)
{
    M(self) *m = self;
    M(start) *start = &m->u.start;
    roln_real qbar[M(N)];
    const roln_status st = M(init_pod)(&m->p, count, q, qd, qbar, &seed, &start->init_pod);
    if (st != ROLN_OK || zoom == 1) return st;
    m->p.scale.q /= (roln_real)zoom;
    return roln_ae_init_pod(&M(model).ae, count, q, 1 / m->p.scale.q, NULL, m->p.theta, start->init_pod.room, start->init_pod.work);
}

static void M(forget_of)(void *self)
{
    M(self) *m = self;
    memset(&m->o, 0, sizeof m->o);
}

/* A step of Adam with the gradient of the windows b: their loss is added to *loss, their number to *seen. */
static roln_status M(adam_of)(void *self, const roln_loss *weights, const roln_batch *b, double dt, const roln_opt *opt,
                              double *loss, double *seen)
{
    M(self) *m = self;
    roln_status st;
    memset(&m->g, 0, sizeof m->g);
    st = b->qdd ? M(grad_acc)(&m->p, weights, b, &m->g, &m->u.train.grad_acc)
                : M(grad)(&m->p, weights, b, (roln_real)dt, &m->g, &m->u.train.grad);
    if (st == ROLN_OK) st = M(update)(&m->p, opt, &m->o, &m->g, &m->u.train.update);
    if (st != ROLN_OK) return st;
    *loss += (double)roln_loss_total(weights, &m->g.loss), *seen += (double)m->g.windows;
    return ROLN_OK;
}

/* The residual r of one window or sample and, unless J is NULL, its row J by the networks. */
static void M(row_of)(void *self, const roln_loss *weights, const roln_batch *b, double dt, uint64_t seed, roln_real *J,
                      roln_real *r)
{
    M(self) *m = self;
    m->row.seed = seed;
    M(rows)(&m->p, weights, b, (roln_real)dt, 0, !J, &m->row, &m->u.train.rows);
    *r = J ? m->row.r[0] : m->row.next[0];
    if (J) memcpy(J, m->row.J, M(newton_size) * sizeof *J);
}

/* The weight of forces in rows of samples: each is in parts of its own deviation, and all together count as accelerations do.
   0: they have no deviation. */
static roln_real M(weigh_of)(void *self, const roln_batch *b)
{
    M(self) *m = self;
    roln_loss var;
    if (M(variance)(&m->p, b, &var, &m->u.train.variance) != ROLN_OK ||
        M(force_variance)(&m->p, b, m->row.force_variance, &m->u.train.force_variance) != ROLN_OK)
        return 0;
    return var.qdd / M(n);
}

#if ROLNI_AT(1, COLUMN(HEAD_OF)) > 0
/* The scale of M stays what it is at first, 1, of which the logarithm is 0. */
static void M(hold_of)(void *self, roln_real *J, roln_real *r)
{
    enum { WEIGHT = 10 };
    M(self) *m = self;
    *r = M(scale_row)(&m->p, 0, WEIGHT, 0, &m->row) == ROLN_OK ? m->row.r[0] : ROLN_C(0.0) / ROLN_C(0.0);
    if (J) memcpy(J, m->row.J, M(newton_size) * sizeof *J);
}

/* Up to 1.3 times the largest |z| of the range that was fitted, at least 1; z that is no angle. */
static void M(ridge_of)(void *self, roln_real *w)
{
    const M(self) *m = self;
    roln_real most = 1;
    for (int i = 0; i < M(n); i++)
        if (!roln_lnn_angle(&M(model).lnn, i)) most = ROLN_MAX(most, ROLN_MAX(m->p.z_max[i], -m->p.z_min[i]));
    M(newton_ridge)(ROLN_C(0.02), ROLN_C(1.3) * most, w);
}
#endif

/* The loss of accelerations and its gradient g by the networks; NaN where there is none. */
static roln_real M(loss_of)(void *self, const roln_loss *weights, const roln_batch *b, roln_real *g)
{
    M(self) *m = self;
    roln_loss loss = {0};
    roln_real windows = 0;
    const roln_gradient to = {.net = g, .loss = &loss, .windows = &windows}; /* none by the autoencoder, which would cost as much */
    memset(g, 0, M(rest_size) * sizeof *g);
    for (int w = 0; w < b->count; w += BLOCK)
        if (M(i_samples_block)(&m->p, weights, b, rolni_part_of(b, w, BLOCK), &to, &m->u.train.grad_acc) != ROLN_OK)
            return ROLN_C(0.0) / ROLN_C(0.0);
    for (int i = 0; i < M(rest_size); i++)
        g[i] /= windows;
    return roln_loss_total(weights, &loss) / windows;
}

#if ROLN_CHARTED
/* Steps for the encoder as long as `more` says so of their number and what the last one left; then the decoder from all samples. */
static roln_status M(chart_of)(void *self, const roln_batch *b, int (*more)(void *ctx, int steps, double left), void *ctx,
                               int count, const roln_real *q, double *left)
{
    static M(refinement) turn;
    static M(chart) sums;
    M(self) *m = self;
    roln_status st = ROLN_OK;
    roln_real residual = 1;
    memset(&turn, 0, sizeof turn), memset(&sums, 0, sizeof sums);
    for (int k = 0; b && st == ROLN_OK && more(ctx, k, (double)residual); k++)
        st = M(chart_refine)(&m->p, b, &turn, &residual);
    if (st == ROLN_OK || st == ROLN_E_NO_CONVERGENCE) st = M(chart_add)(&m->p, count, q, &sums, &m->u.start.chart_add);
    if (st == ROLN_OK) st = M(chart_solve)(&m->p, &sums, ROLN_CHART_RIDGE, &residual, &m->u.start.chart_solve);
    *left = (double)residual;
    return st;
}
#endif
#endif

extern const struct config M(kind);
const struct config M(kind) = {
    .name = ROLNI_STR(MODEL), .md = &M(model), .size = sizeof(M(self)), .scale = offsetof(M(self), p.scale),
    .dt = offsetof(M(self), p.dt), .theta = offsetof(M(self), p.theta), .N = M(N), .n = M(n), .params = M(theta_size),
    .front = M(ae_size), .packed = M(packed_size), .encode = M(encode_of), .decode = M(decode_of),
    .encode_reference = M(reference_of),
    .step = M(step_of), .reduce = M(reduce_of), .terms = M(terms_of), .jets = M(jets_of), .zdd = M(zdd_of), .errors = M(errors_of),
    .block = M(block_of), .pack = M(pack_of), .open = M(open_of),
#if ROLNI_BITS(COLUMN(STORE_OF)) == 0
    .range = M(range_of),
#endif
#if MODEL_LEARNS
    .blocks = M(blocks), .table = M(table), .init = M(init_of), .forget = M(forget_of), .adam = M(adam_of), .row = M(row_of),
    .weigh = M(weigh_of), .loss = M(loss_of),
#if ROLNI_AT(1, COLUMN(HEAD_OF)) > 0
    .hold = M(hold_of), .ridge = M(ridge_of),
#endif
#if ROLN_CHARTED
    .chart = M(chart_of),
#endif
#endif
};
