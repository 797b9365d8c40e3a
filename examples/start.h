/* SPDX-License-Identifier: MIT */
/* start.h - networks that begin where the regression of regression.h ends: unit of inertia, M, V, damping and dry friction.

   train.c includes it behind its config, report.h and regression.h. It is for models whose coordinates are the joints (n = N, no
   autoencoder) with an exponential mass matrix, no learned base point and no SPD layers: start_possible. The networks are fitted to
   the regression at samples and at random places of their range:

       mass network        U = log(M / unit), mean squares, Riemannian logarithm at the identity
       potential network   the derivative of V along a random direction, in which each joint counts by its rms torque; 0 along an
                           ignorable coordinate, which the networks do not see
       damper, friction    constants c_j and s_j of the regression; v_j = 0.04 rms speeds

   Adam on values that have no noise: 50,000 batches of 64 take 3 s for six joints and networks 16, 16. The model is then positive
   definite by construction. Its M and V are off by a per mille, its torques by more, for gravity and inertia may cancel: so train.c
   goes on with Gauss-Newton on torques of the regression, at the places of start_samples. */

#ifndef START_H
#define START_H

enum { START_PLACES = 20000, START_BATCH = 64, START_MASS = 20000, START_POTENTIAL = 30000 };

/* One network, and what it is fitted to. */
typedef struct {
    const roln_mlp *net;
    roln_real *theta;
    const roln_real *x, *x_t; /* [START_PLACES][in]: inputs; directions, NULL: values are fitted */
    const roln_real *y;       /* [START_PLACES][out]: values, or derivatives along x_t */
} start_target;

/* Nonzero if this model can begin at a regression. */
static int start_possible(void)
{
    const roln_lnn *f = &M(model).lnn;
    return (int)M(n) == (int)M(N) && (int)M(inputs) == 0 && (int)M(actuator) == 0 && f->driven == 0 &&
           f->mass == ROLN_EXPONENTIAL && !f->base && f->layers == 0;
}

/* Gradient of the squared errors over one batch, added to g. Returns the sum of squares of the errors; *norm: that of
   derivatives, or the number of values. */
static double start_gradient(const start_target *t, const int *which, roln_real *room_, roln_real *g, double *norm)
{
    enum { B = START_BATCH };
    const int ni = t->net->size[0], no = t->net->size[t->net->layers], hidden = roln_mlp_hidden(t->net);
    const int planes = t->x_t ? 2 : 1, at = (planes - 1) * B * no; /* the last plane is compared */
    roln_real *x = room_, *y = x + 2 * B * ni, *gy = y + 2 * B * no, *slope = gy + 2 * B * no, *out = slope + B * hidden;
    const roln_mlp_plane plane[2] = {{x, out, planes, 0}, {x + B * ni, out, planes, 1}};
    double sum = 0;
    int i;
    for (i = 0; i < B; i++) {
        memcpy(x + i * ni, t->x + which[i] * ni, sizeof *x * (size_t)ni);
        if (t->x_t) memcpy(x + (B + i) * ni, t->x_t + which[i] * ni, sizeof *x * (size_t)ni);
    }
    roln_mlp_forward(t->net, 1, planes, B, t->theta, x, y, slope, out);
    memset(gy, 0, sizeof *gy * (size_t)(2 * B * no));
    for (*norm = 0, i = 0; i < B * no; i++) {
        const roln_real target = t->y[which[i / no] * no + i % no], off = y[at + i] - target;
        gy[at + i] = 2 * off / B;
        sum += (double)off * (double)off, *norm += t->x_t ? (double)target * (double)target : 1;
    }
    roln_mlp_bwd(t->net, planes, B, t->theta, plane, slope, gy, NULL, g, out + 2 * B * hidden);
    rolni_unseen_bwd(t->net, t->theta, g);
    return sum;
}

/* Adam with a rate that falls as a cosine. Returns the rms error in the last hundred batches, of derivatives over their rms. */
static double start_adam(const start_target *t, int steps, double rate)
{
    enum { B = START_BATCH };
    const int ni = t->net->size[0], no = t->net->size[t->net->layers], P = roln_mlp_params(t->net);
    const int wide = roln_mlp_widest(t->net, 0) + roln_mlp_widest(t->net, 1);
    roln_real *work_ = room((size_t)B * (size_t)(2 * ni + 4 * no + 3 * roln_mlp_hidden(t->net) + 2 * wide), sizeof *work_);
    roln_real *g = room((size_t)P, sizeof *g);
    double *m = room((size_t)P, sizeof *m), *v = room((size_t)P, sizeof *v), sum = 0, norm = 0;
    unsigned seed = 1;
    int which[B], k, i;
    for (k = 1; k <= steps; k++) {
        const double now_ = rate * (k < 100 ? k / 100.0 : 0.5 * (1 + cos(acos(-1.0) * k / steps)) + 1e-3);
        const double c1 = 1 - pow(0.9, k), c2 = 1 - pow(0.999, k);
        double all, off;
        for (i = 0; i < B; i++)
            which[i] = (int)(regression_random(&seed) * START_PLACES);
        memset(g, 0, sizeof *g * (size_t)P);
        off = start_gradient(t, which, work_, g, &all);
        if (k > steps - 100) sum += off, norm += all;
        for (i = 0; i < P; i++) {
            const double x = (double)g[i];
            m[i] += 0.1 * (x - m[i]), v[i] += 0.001 * (x * x - v[i]);
            t->theta[i] -= (roln_real)(now_ * (m[i] / c1) / (sqrt(v[i] / c2) + 1e-12));
        }
    }
    free(work_), free(g), free(m), free(v);
    return norm > 0 ? sqrt(sum / norm) : 0;
}

/* u [n (n + 1) / 2] = log M, the diagonal first. Eigenvalues below 1e-3 of the largest count as that. Returns 0 without a
   result. */
static int start_log(const double *M_, roln_real *u)
{
    enum { n = M(n) };
    static roln_real work_[ROLN_EIG_WORK(M(n))];
    roln_real A[n * n], l[n], Q[n * n];
    int i, j, k, at = n;
    for (i = 0; i < n * n; i++)
        A[i] = (roln_real)M_[i];
    if (roln_eig(n, A, l, Q, work_) != ROLN_OK) return 0;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double sum = 0;
            for (k = 0; k < n; k++) {
                const double least = 1e-3 * fmax((double)l[0], (double)l[n - 1]);
                sum += log(fmax((double)l[k], least)) * (double)Q[k * n + i] * (double)Q[k * n + j];
            }
            u[i == j ? i : at++] = (roln_real)sum;
        }
    return 1;
}

/* Unit of joint j: q_j = unit times what the networks see. */
static double start_unit(const M(params) * p, int j)
{
    const roln_real *each = units_of(p);
    return (double)p->scale.q * (each ? (double)each[j] : 1);
}

/* scale.m = the geometric mean of the inertias: the networks see the same numbers in Nm, mNm and kNm, up to rounding, and the same
   bits if the unit changes by a power of 2. */
static void start_scale(const regression *r, M(params) * p)
{
    double logs = 0;
    int powers = 0, whole, j;
    for (j = 0; j < r->joints; j++) {
        int power;
        logs += log(frexp(r->inertia[j] * start_unit(p, j) * start_unit(p, j), &power));
        powers += power;
    }
    whole = powers / r->joints - (powers % r->joints < 0); /* powers = whole joints + 0 .. joints - 1 */
    p->scale.m = (roln_real)ldexp(exp((logs + (powers - whole * r->joints) * log(2)) / r->joints), whole);
}

/* 1 - tanh(x)^2 has fallen to a half at 0.88, 1 - tanh(x) at 0.55: width of the Stribeck excess of a model in that of a
   regression. */
#define START_FALL 0.62

/* Constants of damping and dry friction. The wide tanh of a regression with a negative factor is a Stribeck excess, which a model
   with ROLN_FRICTION 2 has, too. Quadratic drag begins as it is. */
static void start_friction(const regression *r, M(params) * p)
{
    const roln_lnn *f = &M(model).lnn;
    roln_real *damper = p->theta + rolni_damper_at(f), *friction = p->theta + rolni_friction_at(f);
    const int tri = ROLN_TRI(f->n), end = f->damper_net.layers, outputs = f->damper_net.size[end];
    const int bias = roln_mlp_params(&f->damper_net) - outputs, hidden = f->damper_net.size[end - 1];
    const double t = (double)p->scale.t, m = (double)p->scale.m;
    int i, j;
    for (i = 0; f->damping && i < tri * hidden; i++) /* L hardly depends on z at first */
        damper[bias - outputs * hidden + i] /= 100;
    for (i = 0; f->damping && i < tri; i++)
        damper[bias + i] = 0;
    for (j = 0; j < r->joints; j++) {
        const double u = start_unit(p, j), least = fmin(1e-3 * r->torque[j], r->noise[j] / 10);
        double viscous = 0, dry = 0, excess = 0;
        for (i = 0; i < r->numbers; i++) {
            const regression_number *a = &r->number[i];
            if (a->of != REGRESSION_OF_FRICTION || a->i != j) continue;
            if (a->f == 0 && r->speed[j] > 0) viscous = r->x[i] / r->speed[j];
            if (a->f == 1 || a->f == 2) dry += r->x[i];
            if (a->f == 1) excess = fmax(-r->x[i], 0);
        }
        if (f->damping)
            damper[bias + j] = (roln_real)sqrt(fmax(viscous, r->speed[j] > 0 ? least / r->speed[j] : 0) * u * u * t / m);
        if (!f->friction) continue;
        friction[j] = (roln_real)log(fmax(fmax(dry, least) * u * t * t / m, 1e-12));
        friction[f->n + j] = (roln_real)log(fmax(0.04 * r->speed[j] * t / u, 1e-12));
        if (f->friction == 1) continue;
        if (excess > 0) friction[f->n + j] = (roln_real)log(fmax(regression_width[1] * r->speed[j] * t / u, 1e-12));
        friction[2 * f->n + j] = (roln_real)log(fmax(fmax(excess, least) * u * t * t / m, 1e-12));
        friction[3 * f->n + j] = (roln_real)log(fmax(START_FALL * regression_width[0] * r->speed[j] * t / u, 1e-12));
    }
}

/* Inputs, log M, and derivatives of V along random directions, at samples and random places. Returns 0 without a result. */
static int start_targets(const regression *r, const regression_source *of, const M(params) * p, roln_real *x, roln_real *x_t,
                         roln_real *u, roln_real *V_t)
{
    enum { N = M(N) };
    const roln_lnn *f = &M(model).lnn;
    const int in = f->mass_net.size[0], samples = of->first[of->recordings] - of->first[0];
    const double t = (double)p->scale.t, m = (double)p->scale.m, still[N] = {0};
    regression_work w = regression_work_new(r);
    double q[N], other[3][N], M_[N * N], c[3][N] = {{0}};
    unsigned seed = 11;
    int good = 1, i, j, k;
    for (i = 0; i < START_PLACES && good; i++) {
        roln_real z[N], direction[N];
        if (i % 4 == 0) regression_random_place(r, &seed, q);
        else of->sample(of->ctx, of->first[0] + (int)(regression_random(&seed) * samples), q, other[0], other[1], other[2]);
        (void)regression_terms(r, q, still, M_, c[0], c[1], c[2], &w);
        for (V_t[i] = 0, j = 0; j < N; j++) {
            const double u_j = start_unit(p, j), random = 2 * regression_random(&seed) - 1;
            const double along = M(ignores)(p, j) ? 0 : random * r->weight[j] * m / (t * t);
            for (k = 0; k < N; k++)
                M_[j * N + k] *= u_j * start_unit(p, k) / m;
            z[j] = (roln_real)(q[j] / u_j), direction[j] = (roln_real)(along / u_j);
            V_t[i] += (roln_real)(along * c[1][j] * t * t / m);
        }
        if (f->angles) rolni_see(f, 1, z, x + i * in), rolni_see_along(f, 1, x + i * in, direction, x_t + i * in);
        else memcpy(x + i * in, z, sizeof z), memcpy(x_t + i * in, direction, sizeof direction);
        good = start_log(M_, u + i * ROLN_TRI(N));
    }
    regression_work_free(&w);
    return good;
}

/* Places whose torques the regression computes: the first three quarters recorded, the others with q, qd and qdd at random in their
   range. A constant torque is left out: a model has none at rest. Random places where M is not positive definite are left out, too,
   so there may be fewer samples. */
static motion start_samples(const regression *r, const regression_source *of)
{
    enum { N = M(N) };
    const int samples = of->first[of->recordings] - of->first[0];
    const double still[N] = {0};
    regression_work w = regression_work_new(r);
    motion m = {.N = N, .forces = N, .trajectories = 2, .dt = of->dt};
    double q[N], qd[N], qdd[N], M_[N * N], offset[N], c[3][N];
    unsigned seed = 12;
    int i, j, k;
    m.q = room(START_PLACES * N, sizeof *m.q), m.qd = room(START_PLACES * N, sizeof *m.q);
    m.qdd = room(START_PLACES * N, sizeof *m.q), m.tau_mid = room(START_PLACES * N, sizeof *m.q);
    m.first = room(3, sizeof *m.first);
    for (i = 0; i < START_PLACES; i++) {
        of->sample(of->ctx, of->first[0] + (int)(regression_random(&seed) * samples), q, qd, qdd, offset);
        if (i == START_PLACES / 4 * 3) m.first[1] = m.samples;
        if (i >= START_PLACES / 4 * 3) {
            regression_random_place(r, &seed, q);
            for (j = 0; j < N && j < REGRESSION_JOINTS; j++) {
                qd[j] = (2 * regression_random(&seed) - 1) * 2 * r->speed[j];
                qdd[j] = (2 * regression_random(&seed) - 1) * 2 * r->acceleration[j];
            }
        }
        (void)regression_terms(r, q, still, M_, c[0], c[1], offset, &w);
        (void)regression_terms(r, q, qd, M_, c[0], c[1], c[2], &w);
        for (j = 0; j < N; j++) {
            const int at = m.samples * N + j;
            double tau = c[0][j] + c[1][j] + c[2][j] - offset[j];
            for (k = 0; k < N; k++)
                tau += M_[j * N + k] * qdd[k];
            m.q[at] = (roln_real)q[j], m.qd[at] = (roln_real)qd[j], m.qdd[at] = (roln_real)qdd[j], m.tau_mid[at] = (roln_real)tau;
        }
        m.samples += i < START_PLACES / 4 * 3 || regression_cholesky(N, M_);
    }
    m.first[2] = m.samples;
    regression_work_free(&w);
    return m;
}

static void start_free(motion *m)
{
    free(m->q), free(m->qd), free(m->qdd), free(m->tau_mid), free(m->first);
}

/* Writes the networks of p. p has its scales and random networks. Returns 0, and says why, if that is not possible. */
static int start_networks(const regression *r, const regression_source *of, M(params) * p)
{
    const roln_lnn *f = &M(model).lnn;
    const size_t in = (size_t)f->mass_net.size[0], places = START_PLACES;
    roln_real *x = room(places * in, sizeof *x), *x_t = room(places * in, sizeof *x), *V_t = room(places, sizeof *V_t);
    roln_real *u = room(places * (size_t)ROLN_TRI(f->n), sizeof *u);
    const start_target mass = {&f->mass_net, p->theta, x, NULL, u};
    const start_target potential = {&f->potential_net, p->theta + rolni_potential_at(f), x, x_t, V_t};
    int good;
    good = start_targets(r, of, p, x, x_t, u, V_t);
    if (good) {
        const double off_M = start_adam(&mass, START_MASS, 5e-3); /* of log M: relative */
        const double off_V = start_adam(&potential, START_POTENTIAL, 1e-2);
        start_friction(r, p);
        printf("networks begin at the regression: M off by %.2g %%, gravity by %.2g %%, unit of inertia %g\n", 100 * off_M,
               100 * off_V, r->unit * (double)p->scale.m);
    } else printf("networks do not begin at the regression: its M has no logarithm\n");
    free(x), free(x_t), free(V_t), free(u);
    return good;
}

#endif
