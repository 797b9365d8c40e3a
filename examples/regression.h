/* SPDX-License-Identifier: MIT */
/* regression.h - Lagrangian regression: mass matrix, potential and friction from recorded torques, in closed form, in seconds.

       tau = M(q) qdd + c(q, qd) + dV/dq + friction(qd)
       M_ij(q) = sum_k a_ijk f_k(q)      V(q) = sum_k b_k f_k(q)
       friction_j = c_j qd_j + s_j tanh(qd_j / v1) + t_j tanh(qd_j / v2) + o_j

   Each f_k is a product of functions of different joints: cos q, sin q, cos 2q, sin 2q of a hinge, q .. q^4 of a slider. Its degree
   is the sum of their degrees: 1, 1, 2, 2 and 1 .. 4. Inverse dynamics is linear in a, b, c, s, t, o. So they are one linear least
   squares problem, which needs no geometry and no start.

   - Rows are divided by the rms torque of their joint, columns by their norm. Units of q, t and tau make no difference.
   - Weak form: a row is the mean of inverse dynamics over 80 ms, from half of that to half of that. In the mean the noise of qdd is
     that of qd at both ends, 80 ms apart, and what friction and filters blur for a moment averages out.
   - The normal equations are summed row by row, in four folds. Cross-validation over the folds chooses degrees and ridge.
   - Chain order: M_ij of a serial chain does not depend on joints 0 .. i, i <= j. It is used where the error does not grow.
   - A joint on which M and V need not depend is left out of them: a vertical first axis, say. Its test: in cross-validation the
     torque error without it is larger by 0.001 % of the torque at most.
   - M is positive definite at samples and at random places of their range. ADMM alternates between the regression and the nearest
     matrix M >= diag(floor). One Cholesky factor serves all rounds.

   Double precision, heap, no library but libm, the same result in every run. Cost for six joints and 30,000 samples: 5 to
   11 s, 50 MB.

       regression_new, _free        an empty regression; gives its memory back
       regression_fit               fits it to recordings
       regression_tell              prints what was found, and what recordings cannot tell
       regression_terms             M, Coriolis term, gravity term, friction, V at one state
       regression_torque            inverse dynamics
       regression_accelerate        forward dynamics
       regression_step              one step of time, Runge-Kutta
       regression_errors            torque error, and error of roll-outs at one horizon

   1 types     2 functions of q     3 rows     4 linear algebra     5 sums     6 choice     7 projection     8 fit     9 use */

#ifndef REGRESSION_H
#define REGRESSION_H

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- 1 types ---- */

enum {
    REGRESSION_JOINTS = 32,
    REGRESSION_FACTORS = 4, /* joints of one function, at most */
    REGRESSION_KINDS = 4,   /* functions of one joint */
    REGRESSION_FRICTION = 4,
    REGRESSION_FOLDS = 4
};

/* Narrow and wide tanh of friction, in rms speeds of the joint. Their difference is a Stribeck curve. */
static const double regression_width[2] = {0.1, 0.02};

typedef enum {
    REGRESSION_OK,
    REGRESSION_E_NOT_FINITE, /* a sample has a number that is not finite */
    REGRESSION_E_FEW,        /* fewer samples than the smallest model has numbers */
    REGRESSION_E_STILL,      /* no joint moves */
    REGRESSION_E_TORQUE,     /* all torques are 0, or no torque changes */
    REGRESSION_E_JOINTS,     /* no joint, or more than REGRESSION_JOINTS */
    REGRESSION_E_SOLVE       /* the normal equations have no finite solution */
} regression_status;

/* Recordings. sample(ctx, i, ..) writes q, qd, qdd, tau [joints] of sample i. Recording k has the samples
   first[k] .. first[k + 1] - 1. regression_fit passes over them five times, sample by sample. */
typedef struct {
    int recordings;
    const int *first;
    double dt;
    void (*sample)(void *ctx, int i, double *q, double *qd, double *qdd, double *tau);
    void *ctx;
} regression_source;

/* Product of functions of `factors` joints. */
typedef struct {
    int factors, degree;
    unsigned char joint[REGRESSION_FACTORS], kind[REGRESSION_FACTORS];
} regression_function;

/* One unknown: of M_ij, i <= j, or of V, times function f; or of friction of joint i, term f. */
typedef struct {
    enum { REGRESSION_OF_M, REGRESSION_OF_V, REGRESSION_OF_FRICTION } of;
    int i, j, f;
} regression_number;

/* Which numbers a model has. */
typedef struct {
    int degree_M, degree_V;
    int chain;       /* nonzero: M_ij does not depend on joints 0 .. i */
    unsigned unused; /* bit j: M and V do not depend on q_j */
} regression_shape;

typedef struct {
    /* input */
    int joints;
    double turn[REGRESSION_JOINTS]; /* a full turn in the unit of q: 2 pi, 360; 0: a slider */
    int most;                       /* numbers of the model, at most */
    double work;                    /* multiplications for one pass of sums, at most: samples are left out beyond it */

    /* of the recordings: samples used, range of q, rms of qd, qdd, tau; bit j: joint does not move, its torque does not change */
    int samples;
    double low[REGRESSION_JOINTS], high[REGRESSION_JOINTS];
    double speed[REGRESSION_JOINTS], acceleration[REGRESSION_JOINTS], torque[REGRESSION_JOINTS];
    double weight[REGRESSION_JOINTS]; /* of a row: 1 / torque, or as a joint without torque has it */
    unsigned still, constant;

    /* the model */
    regression_shape shape;
    int functions, numbers;
    regression_function *function;
    regression_number *number;
    double *x; /* [numbers] */

    /* how it was found */
    double ridge, error;               /* error: rms of (tau_model - tau) / torque in validation, over joints */
    double told;                       /* how many numbers the recordings tell, beside the ridge */
    double error_chain, error_free;    /* errors of a small model with and without chain order */
    double with[REGRESSION_JOINTS], without[REGRESSION_JOINTS]; /* and with M and V of all joints, and not of this one */
    double inertia[REGRESSION_JOINTS]; /* mean of M_jj; if it is not above its noise, what the noise would hide */
    double floor[REGRESSION_JOINTS];   /* M >= diag(floor) where it was projected */
    double inertial[REGRESSION_JOINTS], noise[REGRESSION_JOINTS]; /* rms of M qdd and of tau_model - tau, in training */
    double unit; /* of torques, for regression_tell */
    int places, indefinite; /* places of the last test of M, and how many had M that is not positive definite */
} regression;

/* Scratch of one thread. */
typedef struct {
    double *f, *fd, *g; /* functions, their time derivatives, their gradients by factor */
    double *A;          /* rows [joints][numbers] */
} regression_work;

static void *regression_room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (p) return p;
    fprintf(stderr, "regression: out of memory: %.0f times %.0f bytes\n", (double)count, (double)size);
    exit(1);
}

/* An empty regression. turn [joints]: a full turn of a hinge in the unit of q, 0 for a slider. */
static regression regression_new(int joints, const double *turn)
{
    regression r;
    memset(&r, 0, sizeof r);
    r.joints = joints, r.most = 1300, r.work = 1e10, r.unit = 1;
    if (joints > 0 && joints <= REGRESSION_JOINTS) memcpy(r.turn, turn, sizeof *turn * (size_t)joints);
    return r;
}

static void regression_free(regression *r)
{
    free(r->function), free(r->number), free(r->x);
    r->function = NULL, r->number = NULL, r->x = NULL;
}

/* ---- 2 functions of q ---- */

static int regression_degree(const regression *r, int joint, int kind)
{
    return r->turn[joint] > 0 ? 1 + kind / 2 : 1 + kind;
}

/* Appends f and all products of f with functions of joints from `from` on, up to a degree; stops beyond `most` functions. */
static void regression_products(regression *r, const regression_function *f, int from, int degree, unsigned unused, int most)
{
    int j, k;
    if (r->functions > most) return;
    if ((r->functions & (r->functions - 1)) == 0) { /* room for twice as many */
        regression_function *all = regression_room(2 * (size_t)r->functions + 1, sizeof *all);
        if (r->functions) memcpy(all, r->function, sizeof *all * (size_t)r->functions);
        free(r->function), r->function = all;
    }
    r->function[r->functions++] = *f;
    if (f->factors == REGRESSION_FACTORS) return;
    for (j = from; j < r->joints; j++)
        for (k = 0; k < REGRESSION_KINDS && !(unused >> j & 1); k++) {
            regression_function g = *f;
            g.degree += regression_degree(r, j, k);
            if (g.degree > degree) continue;
            g.joint[g.factors] = (unsigned char)j, g.kind[g.factors++] = (unsigned char)k;
            regression_products(r, &g, j + 1, degree, unused, most);
        }
}

/* Joints of f; with twice = 1 only hinges of which f has cos 2q or sin 2q. */
static unsigned regression_joints(const regression *r, const regression_function *f, int twice)
{
    unsigned joints = 0;
    int a;
    for (a = 0; a < f->factors; a++)
        if (!twice || (r->turn[f->joint[a]] > 0 && f->kind[a] >= 2)) joints |= 1u << f->joint[a];
    return joints;
}

/* Nonzero if a model of this shape has the number. Of a serial chain, gravity has no cos 2q, and M_ij none of joints up to j. */
static int regression_has(const regression *r, const regression_shape *s, const regression_number *t)
{
    const regression_function *f = &r->function[t->f];
    if (t->of == REGRESSION_OF_FRICTION) return 1;
    if (regression_joints(r, f, 0) & s->unused) return 0;
    if (t->of == REGRESSION_OF_V) return f->factors > 0 && f->degree <= s->degree_V && !regression_joints(r, f, 1);
    if (f->degree > s->degree_M) return 0;
    if (!s->chain) return 1;
    return !(regression_joints(r, f, 0) & ((2u << t->i) - 1)) && !(regression_joints(r, f, 1) & ((2u << t->j) - 1));
}

static void regression_append(regression *r, const regression_shape *s, regression_number t, int store)
{
    if (!regression_has(r, s, &t)) return;
    if (store) r->number[r->numbers] = t;
    r->numbers++;
}

static void regression_list(regression *r, const regression_shape *s, int store)
{
    int i, j, f;
    r->numbers = 0;
    for (i = 0; i < r->joints; i++)
        for (j = i; j < r->joints; j++)
            for (f = 0; f < r->functions; f++)
                regression_append(r, s, (regression_number){REGRESSION_OF_M, i, j, f}, store);
    for (f = 0; f < r->functions; f++)
        regression_append(r, s, (regression_number){REGRESSION_OF_V, 0, 0, f}, store);
    for (i = 0; i < r->joints; i++)
        for (f = 0; f < REGRESSION_FRICTION; f++)
            regression_append(r, s, (regression_number){REGRESSION_OF_FRICTION, i, i, f}, store);
}

/* Gives r the functions and numbers of a shape. Returns 0, and gives none, if there are more than `most`. */
static int regression_build(regression *r, const regression_shape *s, int most)
{
    static const regression_function one = {0, 0, {0}, {0}};
    regression_free(r);
    r->functions = r->numbers = 0, r->shape = *s;
    regression_products(r, &one, 0, s->degree_M > s->degree_V ? s->degree_M : s->degree_V, s->unused, 4 * most);
    if (r->functions <= 4 * most) regression_list(r, s, 0);
    if (r->functions > 4 * most || r->numbers > most) return 0;
    r->number = regression_room((size_t)r->numbers, sizeof *r->number);
    r->x = regression_room((size_t)r->numbers, sizeof *r->x);
    regression_list(r, s, 1);
    return 1;
}

/* ---- 3 rows ---- */

static regression_work regression_work_new(const regression *r)
{
    regression_work w;
    w.f = regression_room((size_t)r->functions, sizeof *w.f), w.fd = regression_room((size_t)r->functions, sizeof *w.fd);
    w.g = regression_room((size_t)r->functions * REGRESSION_FACTORS, sizeof *w.g);
    w.A = regression_room((size_t)r->numbers * (size_t)r->joints, sizeof *w.A);
    return w;
}

static void regression_work_free(regression_work *w)
{
    free(w->f), free(w->fd), free(w->g), free(w->A);
}

/* Functions of one joint, and their derivatives by q. */
static void regression_of_joint(const regression *r, int j, double q, double *b, double *db)
{
    if (r->turn[j] > 0) {
        const double u = 2 * acos(-1.0) / r->turn[j], c = cos(u * q), s = sin(u * q);
        b[0] = c, b[1] = s, b[2] = c * c - s * s, b[3] = 2 * c * s;
        db[0] = -u * s, db[1] = u * c, db[2] = -2 * u * b[3], db[3] = 2 * u * b[2];
    } else {
        const double half = r->high[j] > r->low[j] ? (r->high[j] - r->low[j]) / 2 : 1;
        const double x = (q - (r->high[j] + r->low[j]) / 2) / half, u = 1 / half;
        b[0] = x, b[1] = x * x, b[2] = x * x * x, b[3] = x * x * x * x;
        db[0] = u, db[1] = 2 * u * x, db[2] = 3 * u * x * x, db[3] = 4 * u * x * x * x;
    }
}

/* All functions at q, df/dt along qd, and df/dq of each factor. */
static void regression_functions(const regression *r, const double *q, const double *qd, regression_work *w)
{
    double b[REGRESSION_JOINTS][REGRESSION_KINDS], db[REGRESSION_JOINTS][REGRESSION_KINDS];
    int j, k, a, c;
    for (j = 0; j < r->joints; j++)
        regression_of_joint(r, j, q[j], b[j], db[j]);
    for (k = 0; k < r->functions; k++) {
        const regression_function *f = &r->function[k];
        w->f[k] = 1, w->fd[k] = 0;
        for (a = 0; a < f->factors; a++)
            w->f[k] *= b[f->joint[a]][f->kind[a]];
        for (a = 0; a < f->factors; a++) {
            double g = db[f->joint[a]][f->kind[a]];
            for (c = 0; c < f->factors; c++)
                if (c != a) g *= b[f->joint[c]][f->kind[c]];
            w->g[k * REGRESSION_FACTORS + a] = g, w->fd[k] += g * qd[f->joint[a]];
        }
    }
}

static double regression_rub(const regression *r, int j, int term, double qd)
{
    const double u = r->speed[j] > 0 ? qd / r->speed[j] : 0;
    return term == 0 ? u : term == 3 ? 1 : tanh(u / regression_width[term - 1]);
}

/* Derivatives of inverse dynamics by the numbers: w->A [joints][numbers]. Of a_ijk, with E the matrix that has 1 at ij and ji:
   f E qdd + (df/dt) E qd - 1/2 (qd^T E qd) df/dq; of b_k: df/dq. */
static void regression_rows(const regression *r, const double *q, const double *qd, const double *qdd, regression_work *w)
{
    const int P = r->numbers;
    double *A = w->A;
    int p, a;
    memset(A, 0, sizeof *A * (size_t)(r->joints * P));
    regression_functions(r, q, qd, w);
    for (p = 0; p < P; p++) {
        const regression_number t = r->number[p];
        const regression_function *f = &r->function[t.f];
        double by_gradient = 1;
        if (t.of == REGRESSION_OF_FRICTION) {
            A[t.i * P + p] = regression_rub(r, t.i, t.f, qd[t.i]);
            continue;
        }
        if (t.of == REGRESSION_OF_M) {
            by_gradient = -qd[t.i] * qd[t.j] * (t.i == t.j ? 0.5 : 1);
            A[t.i * P + p] = w->f[t.f] * qdd[t.j] + w->fd[t.f] * qd[t.j];
            A[t.j * P + p] = w->f[t.f] * qdd[t.i] + w->fd[t.f] * qd[t.i];
        }
        for (a = 0; a < f->factors; a++)
            A[f->joint[a] * P + p] += by_gradient * w->g[t.f * REGRESSION_FACTORS + a];
    }
}

/* M [joints][joints], the Coriolis term c, the gravity term dV/dq and friction [joints] at one state. Returns V. */
static double regression_terms(const regression *r, const double *q, const double *qd, double *M, double *c, double *gravity,
                               double *friction, regression_work *w)
{
    const int N = r->joints;
    double V = 0;
    int p, a;
    memset(M, 0, sizeof *M * (size_t)(N * N)), memset(c, 0, sizeof *c * (size_t)N);
    memset(gravity, 0, sizeof *gravity * (size_t)N), memset(friction, 0, sizeof *friction * (size_t)N);
    regression_functions(r, q, qd, w);
    for (p = 0; p < r->numbers; p++) {
        const regression_number t = r->number[p];
        const regression_function *f = &r->function[t.f];
        const double x = r->x[p], *g = w->g + t.f * REGRESSION_FACTORS;
        if (t.of == REGRESSION_OF_FRICTION) friction[t.i] += x * regression_rub(r, t.i, t.f, qd[t.i]);
        else if (t.of == REGRESSION_OF_V) {
            V += x * w->f[t.f];
            for (a = 0; a < f->factors; a++)
                gravity[f->joint[a]] += x * g[a];
        } else {
            const double half = x * qd[t.i] * qd[t.j] * (t.i == t.j ? 0.5 : 1);
            M[t.i * N + t.j] += x * w->f[t.f], c[t.i] += x * w->fd[t.f] * qd[t.j];
            if (t.i != t.j) M[t.j * N + t.i] += x * w->f[t.f], c[t.j] += x * w->fd[t.f] * qd[t.i];
            for (a = 0; a < f->factors; a++)
                c[f->joint[a]] -= half * g[a];
        }
    }
    return V;
}

/* ---- 4 linear algebra ---- */

static double regression_dot(int n, const double *a, const double *b)
{
    double s[8] = {0}, sum;
    int i, k;
    for (i = 0; i + 8 <= n; i += 8)
        for (k = 0; k < 8; k++)
            s[k] += a[i + k] * b[i + k];
    sum = ((s[0] + s[1]) + (s[2] + s[3])) + ((s[4] + s[5]) + (s[6] + s[7]));
    for (; i < n; i++)
        sum += a[i] * b[i];
    return sum;
}

/* A = L L^T in place, lower triangles. Returns 0 if A is not positive definite. */
static int regression_cholesky(int n, double *A)
{
    int i, j;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double *a = A + (size_t)i * (size_t)n, *b = A + (size_t)j * (size_t)n;
            const double s = a[j] - regression_dot(j, a, b);
            if (i == j && !(s > 0 && s < HUGE_VAL)) return 0;
            a[j] = i == j ? sqrt(s) : s / b[j];
        }
    return 1;
}

/* x = (L L^T)^-1 x */
static void regression_solve(int n, const double *L, double *x)
{
    int i, k;
    for (i = 0; i < n; i++)
        x[i] = (x[i] - regression_dot(i, L + (size_t)i * (size_t)n, x)) / L[(size_t)i * (size_t)n + (size_t)i];
    for (i = n - 1; i >= 0; i--) {
        const double *l = L + (size_t)i * (size_t)n;
        x[i] /= l[i];
        for (k = 0; k < i; k++)
            x[k] -= l[k] * x[i];
    }
}

/* The nearest positive semidefinite matrix of a symmetric one, by Jacobi rotations: A [n][n] in place. */
static void regression_nearest(int n, double *A)
{
    double V[REGRESSION_JOINTS * REGRESSION_JOINTS], value[REGRESSION_JOINTS];
    int sweep, p, q, k;
    for (k = 0; k < n * n; k++)
        V[k] = k % (n + 1) == 0;
    for (sweep = 0; sweep < 30; sweep++) {
        double off = 0, all = 0;
        for (k = 0; k < n * n; k++)
            all += A[k] * A[k], off += k % (n + 1) == 0 ? 0 : A[k] * A[k];
        if (!(off > 1e-24 * all)) break;
        for (p = 0; p < n; p++)
            for (q = p + 1; q < n; q++) {
                const double a = A[p * n + q], turn = (A[q * n + q] - A[p * n + p]) / 2;
                const double t = a == 0 ? 0 : a / (turn + (turn < 0 ? -1 : 1) * hypot(turn, a)), c = 1 / sqrt(t * t + 1), s = t * c;
                for (k = 0; k < n; k++) {
                    const double x = A[k * n + p], y = A[k * n + q], u = V[k * n + p], v = V[k * n + q];
                    A[k * n + p] = c * x - s * y, A[k * n + q] = s * x + c * y;
                    V[k * n + p] = c * u - s * v, V[k * n + q] = s * u + c * v;
                }
                for (k = 0; k < n; k++) {
                    const double x = A[p * n + k], y = A[q * n + k];
                    A[p * n + k] = c * x - s * y, A[q * n + k] = s * x + c * y;
                }
            }
    }
    for (k = 0; k < n; k++)
        value[k] = A[k * n + k] > 0 ? A[k * n + k] : 0;
    for (p = 0; p < n; p++)
        for (q = 0; q < n; q++)
            for (A[p * n + q] = 0, k = 0; k < n; k++)
                A[p * n + q] += value[k] * V[p * n + k] * V[q * n + k];
}

/* ---- 5 sums ---- */

/* Normal equations of weighted rows: G = A^T A, lower triangle, b = A^T tau, square = |tau|^2. */
typedef struct {
    double *G, *b, square;
    int rows;
} regression_sums;

enum { REGRESSION_BLOCK = 64 }; /* samples that are added together */

/* The rows of one joint: the numbers that reach it, and their values [REGRESSION_BLOCK][stride]. */
typedef struct {
    int count, stride, *which;
    double *A;
} regression_panel;

/* G += A^T A of `rows` samples. */
static void regression_add_panel(const regression_panel *p, int rows, int P, double *G)
{
    int a, b, s, i, j;
    for (a = 0; a < p->count; a += 4)
        for (b = 0; b < a + 4; b += 8) {
            double c[4][8] = {{0}};
            for (s = 0; s < rows; s++) {
                const double *x = p->A + s * p->stride + a, *y = p->A + s * p->stride + b;
                for (i = 0; i < 4; i++)
                    for (j = 0; j < 8; j++)
                        c[i][j] += x[i] * y[j];
            }
            for (i = 0; i < 4 && a + i < p->count; i++)
                for (j = 0; j < 8 && b + j <= a + i; j++)
                    G[(size_t)p->which[a + i] * (size_t)P + (size_t)p->which[b + j]] += c[i][j];
        }
}

static regression_panel regression_panel_of(const regression *r, int joint)
{
    regression_panel p = {0, r->numbers + 16, NULL, NULL};
    int k;
    p.which = regression_room((size_t)r->numbers, sizeof *p.which);
    p.A = regression_room(REGRESSION_BLOCK * (size_t)p.stride, sizeof *p.A);
    for (k = 0; k < r->numbers; k++) {
        const regression_number *t = &r->number[k];
        unsigned joints = t->of == REGRESSION_OF_FRICTION ? 0 : regression_joints(r, &r->function[t->f], 0);
        if (t->of != REGRESSION_OF_V) joints |= 1u << t->i | 1u << t->j;
        if (joints >> joint & 1) p.which[p.count++] = k;
    }
    return p;
}

/* Samples that a row is the mean of. */
static int regression_wide(const regression_source *d)
{
    return (int)fmax(1, floor(0.08 / d->dt + 0.5));
}

/* Every how many samples a row begins: after half of one, sooner if rows were few beside the numbers, later if sums cost more than
   r->work. */
static int regression_stride(const regression *r, const regression_source *d)
{
    const double cost = (double)r->samples * r->joints * r->numbers * r->numbers / 4;
    const double few = (double)r->samples * r->joints / (4.0 * r->numbers);
    return (int)fmax(1, fmax(ceil(cost / r->work), fmin(regression_wide(d) / 2, floor(few))));
}

static regression_sums *regression_sums_new(int P)
{
    regression_sums *s = regression_room(REGRESSION_FOLDS + 1, sizeof *s);
    int k;
    for (k = 0; k <= REGRESSION_FOLDS; k++) {
        s[k].G = regression_room((size_t)P * (size_t)P, sizeof *s->G), s[k].b = regression_room((size_t)P, sizeof *s->b);
        s[k].square = 0, s[k].rows = 0;
    }
    return s;
}

static void regression_sums_free(regression_sums *s)
{
    int k;
    for (k = 0; k <= REGRESSION_FOLDS; k++)
        free(s[k].G), free(s[k].b);
    free(s);
}

/* Where samples gather until they are added: a panel for each joint, with `at` rows. */
typedef struct {
    regression_panel panel[REGRESSION_JOINTS];
    regression_work work;
    int at;
} regression_gathering;

/* Adds the weighted rows of samples from .. to - 1, their mean, to the panels, and its part of b and |tau|^2 to the sums. */
static void regression_gather(const regression *r, const regression_source *d, int from, int end, regression_gathering *g,
                              regression_sums *to)
{
    double q[4][REGRESSION_JOINTS], tau[REGRESSION_JOINTS] = {0};
    int i, j, c;
    for (j = 0; j < r->joints; j++)
        memset(g->panel[j].A + g->at * g->panel[j].stride, 0, (size_t)g->panel[j].count * sizeof(double));
    for (i = from; i < end; i++) {
        d->sample(d->ctx, i, q[0], q[1], q[2], q[3]);
        regression_rows(r, q[0], q[1], q[2], &g->work);
        for (j = 0; j < r->joints; j++) {
            const regression_panel *p = &g->panel[j];
            const double part = r->weight[j] / (end - from);
            double *row = p->A + g->at * p->stride;
            for (c = 0; c < p->count; c++)
                row[c] += part * g->work.A[j * r->numbers + p->which[c]];
            tau[j] += part * q[3][j];
        }
    }
    for (j = 0; j < r->joints; j++) {
        const regression_panel *p = &g->panel[j];
        const double *row = p->A + g->at * p->stride;
        for (c = 0; c < p->count; c++)
            to->b[p->which[c]] += row[c] * tau[j];
        to->square += tau[j] * tau[j], to->rows++;
    }
    g->at++;
}

/* Adds the products of what was gathered. */
static void regression_flush(const regression *r, regression_gathering *g, regression_sums *to)
{
    int j;
    for (j = 0; j < r->joints; j++)
        regression_add_panel(&g->panel[j], g->at, r->numbers, to->G);
    g->at = 0;
}

/* all += s */
static void regression_add_sums(const regression_sums *s, int P, regression_sums *all)
{
    size_t i;
    for (i = 0; i < (size_t)P * (size_t)P; i++)
        all->G[i] += s->G[i];
    for (i = 0; i < (size_t)P; i++)
        all->b[i] += s->b[i];
    all->square += s->square, all->rows += s->rows;
}

/* The sums of each fold, and of all: [REGRESSION_FOLDS + 1]. Whole recordings go to the folds in turn. If there are fewer than two
   for each fold, eighths of recordings do. The first and last sample are left out: their accelerations are one-sided. */
static regression_sums *regression_sum(const regression *r, const regression_source *d)
{
    const int stride = regression_stride(r, d), wide = regression_wide(d), parts = d->recordings < 2 * REGRESSION_FOLDS ? 8 : 1;
    regression_sums *s = regression_sums_new(r->numbers);
    regression_gathering g;
    int k, part, i, j;
    for (j = 0; j < r->joints; j++)
        g.panel[j] = regression_panel_of(r, j);
    g.work = regression_work_new(r), g.at = 0;
    for (k = 0; k < d->recordings; k++)
        for (part = 0; part < parts; part++) {
            const int from = d->first[k] + 1, length = d->first[k + 1] - 1 - from;
            const int end = from + (int)((double)length * (part + 1) / parts);
            regression_sums *to = s + (part + k) % REGRESSION_FOLDS;
            for (i = from + (int)((double)length * part / parts); i < end; i += stride) {
                regression_gather(r, d, i, end < i + wide ? end : i + wide, &g, to);
                if (g.at == REGRESSION_BLOCK) regression_flush(r, &g, to);
            }
            regression_flush(r, &g, to);
        }
    for (k = 0; k < REGRESSION_FOLDS; k++)
        regression_add_sums(s + k, r->numbers, s + REGRESSION_FOLDS);
    for (j = 0; j < r->joints; j++)
        free(g.panel[j].which), free(g.panel[j].A);
    regression_work_free(&g.work);
    return s;
}

/* ---- 6 choice ---- */

/* Ridge of a number relative to others, with columns of norm 1. Friction and the constants of M_jj are hardly held: a pull to 0
   would make joints too light. V is held less than M, for gravity is seen better than inertia. Measured: docs/accuracy.md. */
static double regression_pull(const regression_number *t)
{
    if (t->of == REGRESSION_OF_FRICTION || (t->of == REGRESSION_OF_M && t->i == t->j && t->f == 0)) return 1e-3;
    return t->of == REGRESSION_OF_V ? 0.03 : t->i == t->j ? 1 : 3;
}

/* Numbers `which` [n] of the sums a - b, b NULL: of a. L [n][n], x [n]: factor and solution, of columns of norm 1; scale [n]: the
   inverse norms. Returns 0 if there is none. */
static int regression_solve_some(const regression *r, const regression_sums *a, const regression_sums *b, int n, const int *which,
                                 double ridge, double *L, double *x, double *scale)
{
    const size_t P = (size_t)r->numbers;
    int i, j;
    for (i = 0; i < n; i++) {
        const size_t at = (size_t)which[i] * (P + 1);
        const double g = a->G[at] - (b ? b->G[at] : 0);
        scale[i] = g > 1e-14 * a->G[at] && g > 0 ? 1 / sqrt(g) : 0;
    }
    for (i = 0; i < n; i++) {
        double *l = L + (size_t)i * (size_t)n;
        for (j = 0; j <= i; j++) {
            const size_t at = (size_t)which[i] * P + (size_t)which[j];
            l[j] = scale[i] * scale[j] * (a->G[at] - (b ? b->G[at] : 0));
        }
        l[i] += scale[i] > 0 ? ridge * regression_pull(&r->number[which[i]]) : 1;
        x[i] = scale[i] * (a->b[which[i]] - (b ? b->b[which[i]] : 0));
    }
    if (!regression_cholesky(n, L)) return 0;
    regression_solve(n, L, x);
    for (i = 0; i < n; i++)
        x[i] *= scale[i];
    return 1;
}

/* rms of the weighted rows' errors in the folds that were left out. */
static double regression_validate(const regression *r, const regression_sums *s, int n, const int *which, double ridge, double *L)
{
    const size_t P = (size_t)r->numbers;
    double *x = regression_room((size_t)n, sizeof *x), *scale = regression_room((size_t)n, sizeof *x), sum = 0;
    int k, i, j;
    for (k = 0; k < REGRESSION_FOLDS && sum < HUGE_VAL; k++) {
        double e = s[k].square;
        if (!regression_solve_some(r, s + REGRESSION_FOLDS, s + k, n, which, ridge, L, x, scale)) e = HUGE_VAL;
        for (i = 0; i < n && e < HUGE_VAL; i++) {
            const double *g = s[k].G + (size_t)which[i] * P;
            double h = g[which[i]] * x[i] / 2 - s[k].b[which[i]];
            for (j = 0; j < i; j++)
                h += g[which[j]] * x[j];
            e += 2 * x[i] * h;
        }
        sum += e == e && e > 0 ? e : e == e ? 0 : HUGE_VAL;
    }
    free(x), free(scale);
    return sqrt(sum / s[REGRESSION_FOLDS].rows);
}

/* The ridge of least error, from *ridge on in steps of sqrt(10): first up, then down. Returns the error. */
static double regression_search(const regression *r, const regression_sums *s, int n, const int *which, double *ridge)
{
    double *L = regression_room((size_t)n * (size_t)n, sizeof *L), best = regression_validate(r, s, n, which, *ridge, L);
    int up, tries, moved = 0;
    for (up = 1; up >= 0 && !(up == 0 && moved); up--)
        for (tries = 0; tries < 24; tries++) {
            const double next = *ridge * pow(10, up ? 0.5 : -0.5);
            const double e = next > 11 || next < 1e-13 ? HUGE_VAL : regression_validate(r, s, n, which, next, L);
            if (!(e < (up ? 1 : 1 - 1e-4) * best)) break;
            best = e, *ridge = next, moved = 1;
        }
    free(L);
    return best;
}

/* Error of a shape that r includes; which [r->numbers]: its numbers, n of them. */
static double regression_try(const regression *r, const regression_sums *s, const regression_shape *shape, int *which, int *n,
                             double *ridge)
{
    int i;
    for (*n = i = 0; i < r->numbers; i++)
        if (regression_has(r, shape, &r->number[i])) which[(*n)++] = i;
    return regression_search(r, s, *n, which, ridge);
}

/* Degrees of M and V, from small to large. */
static const int regression_degrees[][2] = {{0, 1}, {1, 1}, {1, 2}, {1, 3}, {2, 3}, {2, 4}, {3, 4}, {4, 4}};
enum { REGRESSION_SHAPES = sizeof regression_degrees / sizeof *regression_degrees };

/* Builds the largest of these shapes that has at most `most` numbers, and at most half as many as there are rows. Returns its
   place in the list, -1: none. */
static int regression_largest(regression *r, regression_shape s, int most)
{
    const double half = (double)r->samples * r->joints / 2;
    int k;
    if (most > half) most = (int)half;
    for (k = REGRESSION_SHAPES - 1; k >= 0; k--) {
        s.degree_M = regression_degrees[k][0], s.degree_V = regression_degrees[k][1];
        if (regression_build(r, &s, most)) return k;
    }
    return -1;
}

/* Chain order: taken if the error grows by at most 5 %. Then the joints that M and V need not know: without them the error grows
   by at most 1e-5, which the integration of recordings without noise may leave. Returns 0 if the recordings are too short. */
static int regression_structure(regression *r, const regression_source *d)
{
    enum { MOST = 600 };
    const int most = MOST < r->most ? MOST : r->most;
    regression_shape s = {0, 0, 0, 0}, next;
    double ridge = 1e-2, e, before;
    int pass, n, j;
    for (pass = 0; pass < 2; pass++) { /* with chain order the second one has room for higher degrees */
        regression_sums *sums;
        int *which;
        if (regression_largest(r, s, most) < 0) return 0;
        s = r->shape, sums = regression_sum(r, d), which = regression_room((size_t)r->numbers, sizeof *which);
        before = regression_try(r, sums, &s, which, &n, &ridge);
        next = s, next.chain = 1;
        if (pass == 0) {
            r->error_free = before, e = r->error_chain = regression_try(r, sums, &next, which, &n, &ridge);
            if (e <= 1.05 * before + 1e-7) s = next;
        }
        for (j = 0; j < r->joints && pass == 1; j++) {
            next = s, next.unused |= 1u << j;
            e = regression_try(r, sums, &next, which, &n, &ridge);
            r->with[j] = before, r->without[j] = e;
            if (e <= before + 1e-5) s = next, before = e < before ? e : before;
        }
        regression_sums_free(sums), free(which);
    }
    r->shape = s;
    return 1;
}

/* ---- 7 projection ---- */

/* Places where M is projected: q [count][joints], functions there [count][functions]; matrices there: projected, multipliers. */
typedef struct {
    int count;
    double *q, *f, *Z, *U;
} regression_places;

/* A number in 0 .. 1, by a recursion of 32 bits. */
static double regression_random(unsigned *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return (double)(*seed >> 8 & 0xffffffu) / 0x1000000;
}

static void regression_random_place(const regression *r, unsigned *seed, double *q)
{
    int j;
    for (j = 0; j < r->joints; j++)
        q[j] = r->low[j] + (r->high[j] - r->low[j]) * regression_random(seed);
}

/* Some samples, and as many places drawn uniformly from their range. */
static regression_places regression_places_of(const regression *r, const regression_source *d, int some)
{
    const int N = r->joints, every = r->samples / some + 1;
    const double still[REGRESSION_JOINTS] = {0};
    regression_places p = {0, NULL, NULL, NULL, NULL};
    regression_work w = regression_work_new(r);
    double other[3][REGRESSION_JOINTS];
    unsigned seed = 1;
    int k, i;
    p.q = regression_room(2 * (size_t)(some + d->recordings) * (size_t)N, sizeof *p.q);
    for (k = 0; k < d->recordings; k++)
        for (i = d->first[k] + 1; i + 1 < d->first[k + 1]; i += every) {
            d->sample(d->ctx, i, p.q + p.count++ * N, other[0], other[1], other[2]);
            regression_random_place(r, &seed, p.q + p.count++ * N);
        }
    p.f = regression_room((size_t)p.count * (size_t)r->functions, sizeof *p.f);
    p.Z = regression_room((size_t)p.count * (size_t)(N * N), sizeof *p.Z);
    p.U = regression_room((size_t)p.count * (size_t)(N * N), sizeof *p.U);
    for (i = 0; i < p.count; i++) {
        regression_functions(r, p.q + i * N, still, &w);
        memcpy(p.f + (size_t)i * (size_t)r->functions, w.f, sizeof *w.f * (size_t)r->functions);
    }
    regression_work_free(&w);
    return p;
}

static void regression_places_free(regression_places *p)
{
    free(p->q), free(p->f), free(p->Z), free(p->U);
}

/* M_ij scaled by unit_i unit_j, from the functions at a place. */
static void regression_M(const regression *r, const double *f, const double *unit, double *M)
{
    const int N = r->joints;
    int p;
    memset(M, 0, sizeof *M * (size_t)(N * N));
    for (p = 0; p < r->numbers && r->number[p].of == REGRESSION_OF_M; p++) {
        const regression_number *t = &r->number[p];
        M[t->i * N + t->j] += r->x[p] * f[t->f] * unit[t->i] * unit[t->j];
        if (t->i != t->j) M[t->j * N + t->i] = M[t->i * N + t->j];
    }
}

/* Z = nearest M + U with M >= diag(floor), U += M - Z, and pull [joints][joints][functions] = sum over places of (Z - U) f. Returns
   the number of places that were not definite. */
static int regression_project(const regression *r, const double *unit, regression_places *at, double *pull)
{
    const int N = r->joints;
    double M[REGRESSION_JOINTS * REGRESSION_JOINTS], L[REGRESSION_JOINTS * REGRESSION_JOINTS];
    int moved = 0, k, i, j, f;
    memset(pull, 0, sizeof *pull * (size_t)(N * N) * (size_t)r->functions);
    for (k = 0; k < at->count; k++) {
        const double *fk = at->f + (size_t)k * (size_t)r->functions;
        double *Z = at->Z + k * N * N, *U = at->U + k * N * N;
        regression_M(r, fk, unit, M);
        for (i = 0; i < N * N; i++)
            Z[i] = M[i] + U[i] - (i % (N + 1) == 0 ? r->floor[i / N] * unit[i / N] * unit[i / N] : 0);
        memcpy(L, Z, sizeof *Z * (size_t)(N * N));
        if (!regression_cholesky(N, L)) regression_nearest(N, Z), moved++;
        for (i = 0; i < N; i++)
            Z[i * N + i] += r->floor[i] * unit[i] * unit[i];
        for (i = 0; i < N * N; i++)
            U[i] += M[i] - Z[i];
        for (i = 0; i < N; i++)
            for (j = i; j < N; j++) {
                const double to = Z[i * N + j] - U[i * N + j];
                double *sum = pull + (size_t)(i * N + j) * (size_t)r->functions;
                for (f = 0; f < r->functions; f++)
                    sum[f] += to * fk[f];
            }
    }
    return moved;
}

/* G += weight A^T A of the rows M_ij(q_s) of all places, in units of the joints; off-diagonal entries count twice. */
static void regression_add_places(const regression *r, const double *unit, double weight, const regression_places *at, double *G)
{
    const int F = r->functions, P = r->numbers;
    double *sum = regression_room((size_t)F * (size_t)F, sizeof *sum);
    int k, a, b;
    for (k = 0; k < at->count; k++)
        for (a = 0; a < F; a++)
            for (b = 0; b <= a; b++)
                sum[a * F + b] += at->f[(size_t)k * (size_t)F + (size_t)a] * at->f[(size_t)k * (size_t)F + (size_t)b];
    for (a = 0; a < P && r->number[a].of == REGRESSION_OF_M; a++)
        for (b = a; b >= 0 && r->number[b].i == r->number[a].i && r->number[b].j == r->number[a].j; b--) {
            const double u = unit[r->number[a].i] * unit[r->number[a].j] * (r->number[a].i == r->number[a].j ? 1 : sqrt(2));
            G[(size_t)a * (size_t)P + (size_t)b] += weight * u * u * sum[r->number[a].f * F + r->number[b].f];
        }
    free(sum);
}

/* r->x with M >= diag(floor) at the places, by ADMM: until that is so, or 200 rounds. M is compared as the part of the torque that
   it makes: M_ij sqrt(acceleration_i acceleration_j / (torque_i torque_j)). Returns 0 without a solution. */
static int regression_definite(regression *r, const regression_sums *s, regression_places *at)
{
    enum { ROUNDS = 200 };
    const int N = r->joints, P = r->numbers;
    const double weight = (double)s->rows / N / at->count;
    double *G = regression_room((size_t)P * (size_t)P, sizeof *G), *scale = regression_room((size_t)P, sizeof *scale);
    double *x = regression_room((size_t)P, sizeof *x);
    double *pull = regression_room((size_t)(N * N) * (size_t)r->functions, sizeof *pull);
    double unit[REGRESSION_JOINTS], fastest = 0;
    int round, good, i, j;
    for (j = 0; j < N; j++)
        fastest = fmax(fastest, r->acceleration[j]);
    for (j = 0; j < N; j++)
        unit[j] = sqrt(r->weight[j] * (r->still >> j & 1 ? fastest : r->acceleration[j]));
    memcpy(G, s->G, sizeof *G * (size_t)P * (size_t)P);
    regression_add_places(r, unit, weight, at, G);
    for (i = 0; i < P; i++) { /* a column that the samples do not have has the norm of the places */
        const double g = s->G[(size_t)i * (size_t)(P + 1)], all = G[(size_t)i * (size_t)(P + 1)];
        scale[i] = g > 0 ? 1 / sqrt(g) : all > 0 ? 1 / sqrt(all) : 1;
    }
    for (i = 0; i < P; i++) {
        for (j = 0; j <= i; j++)
            G[(size_t)i * (size_t)P + (size_t)j] *= scale[i] * scale[j];
        G[(size_t)i * (size_t)(P + 1)] += r->ridge * regression_pull(&r->number[i]) + 1e-14;
    }
    good = regression_cholesky(P, G);
    for (round = 0; good && regression_project(r, unit, at, pull) > 0 && round < ROUNDS; round++) {
        for (i = 0; i < P; i++) {
            const regression_number *t = &r->number[i];
            const double u = t->of == REGRESSION_OF_M ? weight * unit[t->i] * unit[t->j] * (t->i == t->j ? 1 : 2) : 0;
            x[i] = scale[i] * (s->b[i] + (u > 0 ? u * pull[(t->i * N + t->j) * r->functions + t->f] : 0));
        }
        regression_solve(P, G, x);
        for (i = 0; i < P; i++)
            r->x[i] = x[i] * scale[i];
    }
    free(G), free(scale), free(x), free(pull);
    return good;
}

/* ---- 8 fit ---- */

/* Range, rms and weights of the recordings. */
static regression_status regression_measure(regression *r, const regression_source *d)
{
    const int N = r->joints;
    double x[4][REGRESSION_JOINTS], power = 0, mean[REGRESSION_JOINTS] = {0};
    int k, i, j, c;
    for (j = 0; j < N; j++)
        r->low[j] = HUGE_VAL, r->high[j] = -HUGE_VAL, r->speed[j] = r->acceleration[j] = r->torque[j] = 0;
    for (r->samples = k = 0; k < d->recordings; k++)
        for (i = d->first[k] + 1; i + 1 < d->first[k + 1]; i++, r->samples++) {
            d->sample(d->ctx, i, x[0], x[1], x[2], x[3]);
            for (j = 0; j < N; j++) {
                for (c = 0; c < 4; c++)
                    if (!(fabs(x[c][j]) < 1e150)) return REGRESSION_E_NOT_FINITE;
                r->low[j] = fmin(r->low[j], x[0][j]), r->high[j] = fmax(r->high[j], x[0][j]);
                r->speed[j] += x[1][j] * x[1][j], r->acceleration[j] += x[2][j] * x[2][j];
                r->torque[j] += x[3][j] * x[3][j], mean[j] += x[3][j];
            }
        }
    if (r->samples < 16) return REGRESSION_E_FEW;
    for (j = 0; j < N; j++) {
        const double width = r->high[j] - r->low[j], largest = fmax(fabs(r->high[j]), fabs(r->low[j]));
        r->speed[j] = sqrt(r->speed[j] / r->samples), r->acceleration[j] = sqrt(r->acceleration[j] / r->samples);
        r->torque[j] = sqrt(r->torque[j] / r->samples), mean[j] /= r->samples;
        if (!(width > 1e-9 * largest) || !(r->speed[j] > 0) || !(r->acceleration[j] > 0)) r->still |= 1u << j;
        if (!(r->torque[j] * r->torque[j] - mean[j] * mean[j] > 1e-12 * r->torque[j] * r->torque[j])) r->constant |= 1u << j;
        power = fmax(power, r->torque[j] * r->speed[j]);
    }
    if (r->still == (2u << (N - 1)) - 1) return REGRESSION_E_STILL;
    if (r->constant == (2u << (N - 1)) - 1 || !(power > 0)) return REGRESSION_E_TORQUE;
    for (j = 0; j < N; j++) /* a joint without torque: its unit is that of the largest power */
        r->weight[j] = r->torque[j] > 0 ? 1 / r->torque[j] : r->speed[j] > 0 ? r->speed[j] / power : 0;
    return REGRESSION_OK;
}

/* Degrees, ridge and x from the sums of the largest shape that fits. The smallest shape within 1 % of the least error is taken. */
static regression_status regression_choose(regression *r, const regression_source *d, regression_sums **sums)
{
    const regression_shape s = r->shape;
    const int top = regression_largest(r, s, r->most);
    double e[REGRESSION_SHAPES], ridge[REGRESSION_SHAPES], least = HUGE_VAL, start = 1e-2;
    regression_sums *all;
    regression_shape next = s;
    int *which, n, k;
    if (top < 0) return REGRESSION_E_FEW;
    all = regression_sum(r, d), which = regression_room((size_t)r->numbers, sizeof *which);
    for (k = 0; k <= top; k++) {
        next.degree_M = regression_degrees[k][0], next.degree_V = regression_degrees[k][1], ridge[k] = start;
        e[k] = regression_try(r, all, &next, which, &n, &ridge[k]);
        if (e[k] < least) least = e[k], start = ridge[k];
    }
    for (k = 0; k < top && !(e[k] <= 1.01 * least + 1e-9); k++) {}
    free(which), r->ridge = ridge[k], r->error = e[k];
    if (k == top && least < HUGE_VAL) {
        *sums = all;
        return REGRESSION_OK;
    }
    regression_sums_free(all);
    if (!(least < HUGE_VAL)) return REGRESSION_E_SOLVE;
    next.degree_M = regression_degrees[k][0], next.degree_V = regression_degrees[k][1];
    regression_build(r, &next, r->most);
    *sums = regression_sum(r, d);
    return REGRESSION_OK;
}

/* r->x of all sums, and how many numbers they tell: the trace of (G + ridge)^-1 G. */
static int regression_solve_all(regression *r, const regression_sums *all)
{
    const int P = r->numbers;
    double *L = regression_room((size_t)P * (size_t)P, sizeof *L), *scale = regression_room((size_t)P, sizeof *scale);
    double *column = regression_room((size_t)P, sizeof *column);
    int *which = regression_room((size_t)P, sizeof *which), good, i, k;
    for (i = 0; i < P; i++)
        which[i] = i;
    good = regression_solve_some(r, all, NULL, P, which, r->ridge, L, r->x, scale);
    for (r->told = 0, i = 0; i < P && good; i++) { /* |L^-1 e_i|^2 is (G + ridge)^-1_ii */
        double sum = 0;
        for (k = i; k < P; k++) {
            const double *l = L + (size_t)k * (size_t)P;
            column[k] = ((k == i) - regression_dot(k - i, l + i, column + i)) / l[k];
            sum += column[k] * column[k];
        }
        if (scale[i] > 0) r->told += 1 - r->ridge * regression_pull(&r->number[i]) * sum;
    }
    free(L), free(scale), free(column), free(which);
    return good;
}

/* rms of M qdd and of the torque error in training, and the mean of M_jj. */
static void regression_residuals(regression *r, const regression_source *d)
{
    const int N = r->joints, every = r->samples / 5000 + 1;
    double x[4][REGRESSION_JOINTS], M[REGRESSION_JOINTS * REGRESSION_JOINTS], c[3][REGRESSION_JOINTS];
    regression_work w = regression_work_new(r);
    int count = 0, k, i, j, l;
    for (j = 0; j < N; j++)
        r->inertial[j] = r->noise[j] = r->inertia[j] = 0;
    for (k = 0; k < d->recordings; k++)
        for (i = d->first[k] + 1; i + 1 < d->first[k + 1]; i += every, count++) {
            d->sample(d->ctx, i, x[0], x[1], x[2], x[3]);
            regression_terms(r, x[0], x[1], M, c[0], c[1], c[2], &w);
            for (j = 0; j < N; j++) {
                double tau = 0, off;
                for (l = 0; l < N; l++)
                    tau += M[j * N + l] * x[2][l];
                off = tau + c[0][j] + c[1][j] + c[2][j] - x[3][j];
                r->inertial[j] += tau * tau, r->noise[j] += off * off, r->inertia[j] += M[j * N + j];
            }
        }
    for (j = 0; j < N; j++)
        r->inertial[j] = sqrt(r->inertial[j] / count), r->noise[j] = sqrt(r->noise[j] / count), r->inertia[j] /= count;
    regression_work_free(&w);
}

/* Inertias that noise hides, and floors: 2 % of the inertia. A joint that does not move has that of the others, by their torque. */
static void regression_floors(regression *r)
{
    double largest = 0;
    int j;
    for (j = 0; j < r->joints; j++)
        if (!(r->still >> j & 1)) r->inertia[j] = fmax(r->inertia[j], 0.05 * r->noise[j] / r->acceleration[j]);
    for (j = 0; j < r->joints; j++)
        if (!(r->still >> j & 1)) largest = fmax(largest, r->inertia[j]);
    for (j = 0; j < r->joints; j++) {
        if (r->still >> j & 1) r->inertia[j] = largest;
        r->floor[j] = 0.02 * r->inertia[j];
    }
}

/* Tests M at fresh places: r->places, r->indefinite. */
static void regression_test(regression *r)
{
    const int N = r->joints;
    const double still[REGRESSION_JOINTS] = {0};
    double q[REGRESSION_JOINTS], M[REGRESSION_JOINTS * REGRESSION_JOINTS], c[3][REGRESSION_JOINTS];
    regression_work w = regression_work_new(r);
    unsigned seed = 12345;
    for (r->places = r->indefinite = 0; r->places < 2000; r->places++) {
        regression_random_place(r, &seed, q);
        regression_terms(r, q, still, M, c[0], c[1], c[2], &w);
        r->indefinite += !regression_cholesky(N, M);
    }
    regression_work_free(&w);
}

/* Fits r to recordings. Without REGRESSION_OK r has no model. */
static regression_status regression_fit(regression *r, const regression_source *d)
{
    regression_sums *sums = NULL, *all;
    regression_places at;
    regression_status st;
    if (r->joints < 1 || r->joints > REGRESSION_JOINTS) return REGRESSION_E_JOINTS;
    r->still = r->constant = 0;
    if ((st = regression_measure(r, d)) != REGRESSION_OK) return st;
    if (!regression_structure(r, d)) return REGRESSION_E_FEW;
    if ((st = regression_choose(r, d, &sums)) != REGRESSION_OK) return st;
    all = sums + REGRESSION_FOLDS;
    if (!regression_solve_all(r, all)) st = REGRESSION_E_SOLVE;
    if (st == REGRESSION_OK) {
        regression_residuals(r, d), regression_floors(r);
        at = regression_places_of(r, d, 1500);
        if (!regression_definite(r, all, &at)) st = REGRESSION_E_SOLVE;
        regression_places_free(&at);
    }
    if (st == REGRESSION_OK) regression_residuals(r, d), regression_floors(r), regression_test(r);
    regression_sums_free(sums);
    return st;
}

static const char *regression_status_text(regression_status st)
{
    static const char *const text[] = {
        "fitted",
        "a sample has a number that is not finite, or is larger than 1e150",
        "too few samples: the smallest model has more numbers than half of the rows. hint: record more",
        "no joint moves. hint: record motion of all joints",
        "no torque changes. hint: are these the columns of torques?",
        "the number of joints is not in 1 .. 32",
        "the normal equations have no finite solution. hint: look for a wild sample",
    };
    return text[st];
}

/* Prints the model, and what the recordings cannot tell. */
static void regression_tell(const regression *r, FILE *to)
{
    int j;
    fprintf(to, "regression: degree %d of M, %d of V, %s, %d numbers, of which the recordings tell %.0f; ridge %.1g\n",
            r->shape.degree_M, r->shape.degree_V, r->shape.chain ? "chain order" : "no chain order", r->numbers, r->told, r->ridge);
    if (!r->shape.chain)
        fprintf(to, "joints are no chain counted from the base: the torque error is %.3g %% with chain order, %.3g %% without\n",
                100 * r->error_chain, 100 * r->error_free);
    fprintf(to, "torque error in validation blocks: %.2f %% of the rms torque of each joint\n", 100 * r->error);
    fprintf(to, " joint   rms tau     error       %%   inertia  M qdd, rms\n");
    for (j = 0; j < r->joints; j++)
        fprintf(to, "%6d %9.3g %9.3g %7.2f %9.3g %11.3g%s\n", j + 1, r->unit * r->torque[j], r->unit * r->noise[j],
                r->torque[j] > 0 ? 100 * r->noise[j] / r->torque[j] : 0, r->unit * r->inertia[j], r->unit * r->inertial[j],
                r->still >> j & 1 ? "  does not move: its inertia is unknown" : "");
    for (j = 0; j < r->joints; j++) {
        if (r->still >> j & 1) continue;
        if (r->inertial[j] < r->noise[j])
            fprintf(to, "joint %d: inertial torque %.3g is below its noise %.3g\n", j + 1, r->unit * r->inertial[j],
                    r->unit * r->noise[j]);
        if (r->torque[j] > 0 && r->constant >> j & 1) fprintf(to, "joint %d: the torque is constant\n", j + 1);
        if (!(r->torque[j] > 0)) fprintf(to, "joint %d: no torque, so it is taken for a joint without motor\n", j + 1);
        if (r->shape.unused >> j & 1)
            fprintf(to, "joint %d: M and V do not depend on its position: the torque error is %.3g %% without it, %.3g %% with "
                        "it\n", j + 1, 100 * r->without[j], 100 * r->with[j]);
    }
    if (r->indefinite > 0) fprintf(to, "M is not positive definite at %d of %d random places\n", r->indefinite, r->places);
}

/* ---- 9 use ---- */

/* tau [joints] of the motion. */
static void regression_torque(const regression *r, const double *q, const double *qd, const double *qdd, double *tau,
                              regression_work *w)
{
    double M[REGRESSION_JOINTS * REGRESSION_JOINTS], g[REGRESSION_JOINTS], d[REGRESSION_JOINTS];
    int i, j;
    regression_terms(r, q, qd, M, tau, g, d, w);
    for (i = 0; i < r->joints; i++)
        for (tau[i] += g[i] + d[i], j = 0; j < r->joints; j++)
            tau[i] += M[i * r->joints + j] * qdd[j];
}

/* qdd [joints] under tau. Returns 0 if M is not positive definite there. */
static int regression_accelerate(const regression *r, const double *q, const double *qd, const double *tau, double *qdd,
                                 regression_work *w)
{
    double M[REGRESSION_JOINTS * REGRESSION_JOINTS], c[3][REGRESSION_JOINTS];
    int j;
    regression_terms(r, q, qd, M, c[0], c[1], c[2], w);
    if (!regression_cholesky(r->joints, M)) return 0;
    for (j = 0; j < r->joints; j++)
        qdd[j] = tau[j] - c[0][j] - c[1][j] - c[2][j];
    regression_solve(r->joints, M, qdd);
    return 1;
}

/* Steps of h that dry friction needs, which is steep at rest: 1 .. 16. */
static int regression_substeps(const regression *r, double h)
{
    double rate = 0;
    int p;
    for (p = 0; p < r->numbers; p++) {
        const regression_number *t = &r->number[p];
        if (t->of != REGRESSION_OF_FRICTION || t->f < 1 || t->f > 2 || !(r->speed[t->i] > 0)) continue;
        rate = fmax(rate, r->x[p] / (regression_width[t->f - 1] * r->speed[t->i] * r->inertia[t->i]));
    }
    return rate * h > 32 ? 16 : rate * h > 2 ? (int)ceil(rate * h / 2) : 1;
}

/* x = [q, qd] after the time h. The torque changes linearly from tau to tau_end. Returns 0 if M is not positive definite on the
   way. */
static int regression_step(const regression *r, const double *tau, const double *tau_end, double h, double *x, regression_work *w)
{
    const int N = r->joints, steps = regression_substeps(r, h);
    const double part[4] = {0, 0.5, 0.5, 1}, dt = h / steps;
    double y[2 * REGRESSION_JOINTS], sum[2 * REGRESSION_JOINTS], k[2 * REGRESSION_JOINTS], t[REGRESSION_JOINTS];
    int s, i, j;
    for (s = 0; s < steps; s++) {
        memcpy(y, x, sizeof *x * (size_t)(2 * N)), memset(sum, 0, sizeof sum);
        for (i = 0; i < 4; i++) {
            for (j = 0; j < N; j++)
                t[j] = tau[j] + (s + part[i]) / steps * (tau_end[j] - tau[j]), k[j] = y[N + j];
            if (!regression_accelerate(r, y, y + N, t, k + N, w)) return 0;
            for (j = 0; j < 2 * N; j++) {
                sum[j] += k[j] * (i == 1 || i == 2 ? 2 : 1) / 6;
                if (i < 3) y[j] = x[j] + dt * part[i + 1] * k[j];
            }
        }
        for (j = 0; j < 2 * N; j++)
            x[j] += dt * sum[j];
    }
    return 1;
}

/* Errors on recordings. tau, all: rms of tau_model - tau over rms of tau, of each joint and of all together. q: rms of q_pred - q
   over rms of q - mean, at the end of roll-outs of `samples` samples, which begin every `every` samples. constant: the same of
   q + h qd. A roll-out fails if M is not positive definite, or if it ends 100 times farther off than the rms of q. */
typedef struct {
    double tau[REGRESSION_JOINTS], all, q, constant;
    int windows, failed;
} regression_error;

/* mean [joints] of q, unit [joints] in which errors of q are compared, NULL: 1. */
static regression_error regression_errors(const regression *r, const regression_source *d, int samples, int every,
                                          const double *mean, const double *unit)
{
    const int N = r->joints;
    regression_error e = {{0}, 0, 0, 0, 0, 0};
    regression_work w = regression_work_new(r);
    double x[4][REGRESSION_JOINTS], end[4][REGRESSION_JOINTS], y[2 * REGRESSION_JOINTS], tau[REGRESSION_JOINTS];
    double square[REGRESSION_JOINTS] = {0}, squares = 0, width = 0, off = 0, off_constant = 0;
    int k, i, j, s;
    for (k = 0; k < d->recordings; k++)
        for (i = d->first[k] + 1; i + 1 < d->first[k + 1]; i++) {
            double o = 0, v = 0, c = 0;
            int good = 1;
            d->sample(d->ctx, i, x[0], x[1], x[2], x[3]);
            regression_torque(r, x[0], x[1], x[2], tau, &w);
            for (j = 0; j < N; j++)
                e.tau[j] += (tau[j] - x[3][j]) * (tau[j] - x[3][j]), square[j] += x[3][j] * x[3][j];
            if ((i - d->first[k] - 1) % every || i + samples + 1 >= d->first[k + 1]) continue;
            memcpy(y, x[0], sizeof *y * (size_t)N), memcpy(y + N, x[1], sizeof *y * (size_t)N), memcpy(tau, x[3], sizeof tau);
            for (s = 1; s <= samples && good; s++) {
                d->sample(d->ctx, i + s, end[0], end[1], end[2], end[3]);
                good = regression_step(r, tau, end[3], d->dt, y, &w);
                memcpy(tau, end[3], sizeof tau);
            }
            for (j = 0; j < N && good; j++) {
                const double u = unit ? unit[j] : 1, h = samples * d->dt;
                o += pow((y[j] - end[0][j]) / u, 2), v += pow((end[0][j] - mean[j]) / u, 2);
                c += pow((x[0][j] + h * x[1][j] - end[0][j]) / u, 2);
            }
            e.windows++;
            if (good && o < 1e4 * v) off += o, width += v, off_constant += c;
            else e.failed++;
        }
    for (j = 0; j < N; j++)
        e.all += e.tau[j], squares += square[j], e.tau[j] = sqrt(e.tau[j] / square[j]);
    e.all = sqrt(e.all / squares), e.q = sqrt(off / width), e.constant = sqrt(off_constant / width);
    regression_work_free(&w);
    return e;
}

#endif
