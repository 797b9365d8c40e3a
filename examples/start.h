/* SPDX-License-Identifier: MIT */
/* start.h - networks that begin where the regression of regression.h ends: unit of inertia, M, V, damping and dry friction.

   train.c includes it behind its config, report.h and regression.h. It is for models whose coordinates are the joints (n = N, no
   autoencoder) without a learned base point and SPD layers: start_possible. The networks are fitted to the regression at samples
   and at random places of their range:

       mass network        U = log(M / unit), mean squares, Riemannian logarithm at the identity; with ROLN_MASS cholesky the lower
                           triangle L, L L^T = M / unit - floor I; with squares the symmetric root of that in the first columns of L
       potential network   the derivative of V along a random direction, in which each joint counts by its rms torque; 0 along an
                           ignorable coordinate, which the networks do not see
       damper, friction    constants c_j and s_j of the regression; v_j = 0.04 rms speeds

   Polynomials are linear in their coefficients: least squares, in closed form. Else Adam on values that have no noise: 50,000
   batches of 64 take 3 s for six joints and networks 16, 16. The model is then positive definite by construction. Its M and V are
   off by a per mille, its torques by more, for gravity and inertia may cancel: so train.c goes on with Gauss-Newton on torques of
   the regression, at the places of start_samples. */

#ifndef START_H
#define START_H

enum { START_PLACES = 20000, START_BATCH = 64, START_MASS = 20000, START_POTENTIAL = 30000 };

/* One network, and what it is fitted to. */
typedef struct {
    const roln_mlp *net;
    roln_real *theta;
    const roln_real *x, *x_t; /* [START_PLACES][in]: inputs; directions, NULL: values are fitted */
    const roln_real *y;       /* [START_PLACES][out]: values, or derivatives along x_t */
    int relative;             /* 1: errors are told over the rms of y, which is not a logarithm */
} start_target;

/* Nonzero if this model can begin at a regression. */
static int start_possible(void)
{
    const roln_lnn *f = &M(model).lnn;
    return (int)M(n) == (int)M(N) && (int)M(inputs) == 0 && (int)M(actuator) == 0 && f->driven == 0 &&
           !f->base && f->layers == 0;
}

/* Gradient of the squared errors over one batch, added to g. Returns the sum of squares of the errors; *norm: that of
   y if errors are relative, or the number of values. */
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
        sum += (double)off * (double)off, *norm += t->relative ? (double)target * (double)target : 1;
    }
    roln_mlp_bwd(t->net, planes, B, t->theta, plane, slope, gy, NULL, g, out + 2 * B * hidden);
    rolni_unseen_bwd(t->net, t->theta, g);
    return sum;
}

/* Adam with a rate that falls as a cosine. Returns the rms error in the last hundred batches, if relative over that of y. */
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

/* Terms of polynomials at place k, with 1 behind them; or their derivatives along x_t. seen [T]: 0 for those of ignorable
   coordinates. value [T] scratch. */
static void start_terms(const start_target *t, int k, const roln_real *seen, roln_real *value, roln_real *p)
{
    const int ni = t->net->size[0], T = t->net->size[1], degree = t->net->degree;
    const roln_real *x = t->x + k * ni, *x_t = t->x_t ? t->x_t + k * ni : NULL;
    int h;
    rolni_polynomials(ni, degree, 1, x, 0, x_t ? value : p + ni, 0);
    if (x_t) rolni_polynomials_along(ni, degree, x, value, x_t, p + ni);
    memcpy(p, x_t ? x_t : x, sizeof *p * (size_t)ni);
    p[T] = !x_t;
    for (h = 0; h < T; h++)
        p[h] *= seen[h];
}

/* G [out][T + 1]: the products of what the polynomials leave of each value with the terms; with S the sums of the products of
   terms among themselves. Returns the rms of what is left, if relative over that of y. */
static double start_products(const start_target *t, const roln_real *seen, roln_real *S, double *G)
{
    enum { SOME = 256 };
    static roln_real scratch[ROLN_SYM_WORK];
    const int T = t->net->size[1], side = T + 1, no = t->net->size[2];
    roln_real *value = room((size_t)T, sizeof *value), *p = room((size_t)SOME * (size_t)side, sizeof *p);
    double sum = 0, norm = 0;
    int k, i, o, h;
    memset(G, 0, sizeof *G * (size_t)(no * side));
    for (k = 0; k < START_PLACES; k += SOME) {
        const int count = START_PLACES - k < SOME ? START_PLACES - k : SOME;
        for (i = 0; i < count; i++)
            start_terms(t, k + i, seen, value, p + i * side);
        if (S) roln_sym_at(count, side, 0, side, p, S, scratch);
        for (i = 0; i < count * no; i++) {
            const roln_real *of = p + i / no * side;
            double off;
            o = i % no, off = (double)t->y[(k + i / no) * no + o];
            norm += t->relative ? off * off : 1;
            off -= (double)roln_dot(T, t->theta + o * T, of) + (double)(t->theta[no * T + o] * of[T]);
            sum += off * off;
            for (h = 0; h < side; h++)
                G[o * side + h] += off * (double)of[h];
        }
    }
    free(value), free(p);
    return norm > 0 ? sqrt(sum / norm) : 0;
}

/* Least squares of polynomials. Cosine and sine of an angle depend on each other, so the normal equations are damped; what they
   leave is solved for again. An output that is 0 everywhere keeps its small random weights: from 0 Gauss-Newton would not learn it.
   Returns the rms of what is left, if relative over that of y; HUGE_VAL: the normal equations have no solution. */
static double start_least_squares(const start_target *t)
{
    enum { TURNS = 6 };
    const int T = t->net->size[1], side = T + 1, no = t->net->size[2];
    roln_real *S = room((size_t)side * (size_t)(side + 1), sizeof *S), *seen = room((size_t)side * (size_t)no, sizeof *seen);
    roln_real *b = room((size_t)side, sizeof *b), *damp = room((size_t)side, sizeof *damp);
    roln_real *scratch = room((size_t)ROLN_SYM_CHOL_WORK(side), sizeof *scratch);
    double *G = room((size_t)no * (size_t)side, sizeof *G), trace = 0, left_ = HUGE_VAL;
    roln_status st = ROLN_E_NOT_SPD;
    int turn, o, h, k;
    for (h = 0; h < side * no; h++)
        seen[h] = 1;
    rolni_unseen_bwd(t->net, t->theta, seen);
    memset(S, 0, sizeof *S * (size_t)side * (size_t)(side + 1));
    (void)start_products(t, seen, S, G);
    for (h = 0; h < side; h++)
        trace += (double)S[(size_t)h * (size_t)(side + 2)];
    for (; st != ROLN_OK && trace < 1e30; trace *= 8) {
        for (h = 0; h < side; h++)
            damp[h] = (roln_real)(1e-6 * trace / side);
        st = roln_sym_chol(side, damp, S, scratch);
    }
    for (turn = 0; turn < TURNS && st == ROLN_OK; turn++) {
        for (o = 0; o < no; o++) {
            int moves = 0;
            for (k = 0; k < START_PLACES && !moves; k++)
                moves = t->y[k * no + o] < 0 || t->y[k * no + o] > 0;
            for (h = 0; h < side; h++)
                b[h] = (roln_real)G[o * side + h];
            roln_sym_solve(side, S, b, b);
            for (h = 0; h < side && moves; h++)
                t->theta[h < T ? o * T + h : no * T + o] += b[h];
        }
        left_ = start_products(t, seen, NULL, G);
    }
    free(S), free(seen), free(b), free(damp), free(scratch), free(G);
    return left_;
}

/* u: log M; or L, M = L L^T + floor I: its lower triangle, or with squares the symmetric root, behind which columns are 0. Of u the
   diagonal comes first, except with squares. Eigenvalues below 1e-3 of the largest count as that. Returns 0 without a result. */
static int start_root(const double *M_, roln_real *u)
{
    enum { n = M(n), ROOT = (int)M(cholesky), SQUARES = (int)M(squares) };
    static roln_real work_[ROLN_EIG_WORK(M(n))];
    roln_real A[n * n], l[n], Q[n * n];
    double B[n * n];
    int i, j, k, at = n;
    for (i = 0; i < n * n; i++)
        A[i] = (roln_real)M_[i];
    if (roln_eig(n, A, l, Q, work_) != ROLN_OK) return 0;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double sum = 0;
            for (k = 0; k < n; k++) {
                const double least = 1e-3 * fmax((double)l[0], (double)l[n - 1]);
                const double x = fmax((double)l[k] - (ROOT ? (double)M(model).lnn.eigenvalue_floor : 0), least);
                sum += (!ROOT ? log(x) : SQUARES > 0 ? sqrt(x) : x) * (double)Q[k * n + i] * (double)Q[k * n + j];
            }
            B[i * n + j] = B[j * n + i] = sum;
        }
    if (ROOT && SQUARES == 0 && !regression_cholesky(n, B)) return 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < (SQUARES > 0 ? SQUARES : i + 1); j++)
            u[SQUARES > 0 ? i * SQUARES + j : i == j ? i : at++] = j < n ? (roln_real)B[i * n + j] : 0;
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

/* Inputs, roots or log of M, and derivatives of V along random directions, at samples and random places. Returns 0 without a
   result. */
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
        good = start_root(M_, u + i * f->mass_net.size[f->mass_net.layers]);
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

/* Polynomials by least squares, perceptrons by so many steps of Adam. Returns the error as these do. */
static double start_fit(const start_target *t, int steps, double rate)
{
    return t->net->degree > 0 ? start_least_squares(t) : start_adam(t, steps, rate);
}

/* Writes the networks of p. p has its scales and random networks. Returns 0, and says why, if that is not possible. */
static int start_networks(const regression *r, const regression_source *of, M(params) * p)
{
    const roln_lnn *f = &M(model).lnn;
    const size_t in = (size_t)f->mass_net.size[0], places = START_PLACES;
    roln_real *x = room(places * in, sizeof *x), *x_t = room(places * in, sizeof *x), *V_t = room(places, sizeof *V_t);
    roln_real *u = room(places * (size_t)f->mass_net.size[f->mass_net.layers], sizeof *u);
    const start_target mass = {&f->mass_net, p->theta, x, NULL, u, f->mass == ROLN_CHOLESKY};
    const start_target potential = {&f->potential_net, p->theta + rolni_potential_at(f), x, x_t, V_t, 1};
    int good;
    good = start_targets(r, of, p, x, x_t, u, V_t);
    if (good) {
        const double off = start_fit(&mass, START_MASS, 5e-3), off_M = f->mass == ROLN_CHOLESKY ? 2 * off : off; /* M is L L^T */
        const double off_V = start_fit(&potential, START_POTENTIAL, 1e-2);
        good = off_M < HUGE_VAL && off_V < HUGE_VAL;
        start_friction(r, p);
        if (good)
            printf("networks begin at the regression: M off by %.2g %%, gravity by %.2g %%, unit of inertia %g\n", 100 * off_M,
                   100 * off_V, r->unit * (double)p->scale.m);
    }
    if (!good) printf("networks do not begin at the regression: M has no logarithm or root, or least squares have no solution\n");
    free(x), free(x_t), free(V_t), free(u);
    return good;
}

#endif
