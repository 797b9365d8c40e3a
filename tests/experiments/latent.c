/* SPDX-License-Identifier: MIT */
/* latent.c - other models of the motion of z: s = [z; zd], s' = F(s, tau_z), with networks of the same size, and the derivatives of
   <bar, s'> by parameters and state. A, B, V, D, .. are networks, p a momentum:

   MLP      zdd = A(z, zd, tau)                                            structure: none
   HNN      z' = dH/dp,  p' = -dH/dz + tau,  p = zd                        Greydanus, Dzamba, Yosinski 2019
   DHNN     the same + grad D(z, p)                                        Sosanya and Greydanus 2022
   SYMODEN  z' = dH/dp,  p' = -dH/dz - D(z) z' + tau,                      Zhong, Dey, Chakraborty 2020, dissipative
            H = 1/2 p^T W(z) p + V(z),  W = M^-1,  p = W^-1 zd
   COMET    s' = s_0 - its part along grad_s c,  (s_0, c) = A(s, tau)      Kasim and Lim 2022, one constant c

   HNN and DHNN know no mass matrix: zd is their canonical momentum, right only where M = I. A model that saw no force in
   training has no input for one: MLP and COMET then leave tau out. */
#include "experiment.h"

#include <stdlib.h>

enum { N_MAX = 16, HIDDEN = 32, NETS = 3 };

#define LEAST ROLN_C(1e-4) /* W = L L^T + LEAST I */
#define JITTER ROLN_C(0.1) /* COMET's regulariser sees states with this much noise */

struct latent {
    enum latent_kind kind;
    int n, force;       /* force: tau is an input of the network */
    int nets, T[NETS];  /* networks; tangent planes that each needs */
    int at[NETS + 1];   /* where each begins in theta, and its end */
    roln_mlp net[NETS]; /* SYMODEN: L of W, V, L of D */
    roln_real theta[];
};

/* What a pass keeps. */
typedef struct {
    int size;                                           /* numbers in all */
    roln_real *x[NETS], *y[NETS], *gx[NETS], *gy[NETS]; /* of each network [1+T][in], [1+T][out], and cotangents */
    roln_real *slope[NETS], *out[NETS];                 /* [2 HIDDEN], [1+T][2 HIDDEN]: roln_mlp_forward */
    roln_real *g[NETS];                                 /* [in] a gradient by its input */
    roln_real *rate;                                    /* [2n] s' */
    roln_real *L, *L1, *R, *C;                          /* SYMODEN [n][n]: L, DL[zd], L of D, W = C C^T */
    roln_real *p, *f, *nu;                              /* SYMODEN [n]: p, p', cotangent of zd */
    roln_real *row, *work;
} pass;

/* ---- memory ---- */

enum { ROW = 4096 }; /* numbers in a pass, at most */

static roln_real *take(roln_real *mem, int *at, int size)
{
    roln_real *p = mem ? mem + *at : NULL;
    *at += size;
    return p;
}

static pass pass_of(const struct latent *m, roln_real *mem)
{
    const int n = m->n, nn = m->kind == LATENT_SYMODEN ? n * n : 0;
    pass p = {0};
    int k;
    for (k = 0; k < m->nets; k++) {
        const int in = m->net[k].size[0], out = m->net[k].size[m->net[k].layers], T = m->T[k];
        p.x[k] = take(mem, &p.size, (1 + T) * in);
        p.y[k] = take(mem, &p.size, (1 + T) * out);
        p.gx[k] = take(mem, &p.size, (1 + T) * in);
        p.gy[k] = take(mem, &p.size, (1 + T) * out);
        p.slope[k] = take(mem, &p.size, 2 * HIDDEN);
        p.out[k] = take(mem, &p.size, (1 + T) * 2 * HIDDEN);
        p.g[k] = take(mem, &p.size, in);
    }
    p.rate = take(mem, &p.size, 2 * n);
    p.L = take(mem, &p.size, nn);
    p.L1 = take(mem, &p.size, nn);
    p.R = take(mem, &p.size, nn);
    p.C = take(mem, &p.size, nn);
    p.p = take(mem, &p.size, n);
    p.f = take(mem, &p.size, n);
    p.nu = take(mem, &p.size, n);
    p.row = take(mem, &p.size, 2 * nn + 8 * n);
    p.work = take(mem, &p.size, ROLN_MLP_BWD_WORK(1 + m->T[0], 1, HIDDEN + ROLN_MAX(3 * n, HIDDEN)));
    return p;
}

/* ---- networks ---- */

static void add_net(struct latent *m, int T, int in, int out)
{
    const roln_mlp f = {3, {in, HIDDEN, HIDDEN, out}, 0};
    m->net[m->nets] = f;
    m->T[m->nets++] = T;
    m->at[m->nets] = m->at[m->nets - 1] + roln_mlp_params(&f);
}

/* All but theta. */
static struct latent shape(enum latent_kind kind, int n, int force)
{
    struct latent m = {0};
    const int input = kind == LATENT_MLP || kind == LATENT_COMET;
    m.kind = kind, m.n = n, m.force = force && input;
    if (kind == LATENT_SYMODEN) {
        add_net(&m, 2, n, ROLN_TRI(n));
        add_net(&m, 1, n, 1);
        add_net(&m, 0, n, ROLN_TRI(n));
    } else {
        add_net(&m, kind != LATENT_MLP, (2 + m.force) * n, kind == LATENT_MLP ? n : kind == LATENT_COMET ? 2 * n + 1 : 1);
        if (kind == LATENT_DHNN) add_net(&m, 1, 2 * n, 1);
    }
    return m;
}

/* SYMODEN begins with W near I and D near 0; z of a chart is in [-1, 1], where networks that begin steeper learn faster. */
static void init(struct latent *m, double steep, uint64_t *seed)
{
    const int triangles = m->kind == LATENT_SYMODEN;
    int k, i;
    for (k = 0; k < m->nets; k++) {
        roln_mlp_init(&m->net[k], triangles && k != 1 ? ROLN_C(0.1) : 1, m->theta + m->at[k], seed);
        for (i = 0; i < m->net[k].size[0] * HIDDEN; i++)
            m->theta[m->at[k] + i] *= (roln_real)(i / HIDDEN < m->n ? steep : 1);
    }
    for (i = 0; triangles && i < m->n; i++)
        m->theta[m->at[1] - ROLN_TRI(m->n) + i] = 1;
}

/* Plane t, after plane 0: 0 the outputs, 1 .. their derivatives along plane t of x. */
static void forward(const struct latent *m, int k, int t, const pass *p)
{
    const roln_mlp *f = &m->net[k];
    roln_mlp_forward(f, t == 0, 1, 1, m->theta + m->at[k], p->x[k] + t * f->size[0], p->y[k] + t * f->size[f->layers], p->slope[k],
                     p->out[k] + t * 2 * HIDDEN);
}

/* Backward of planes 0 .. planes-1 with the cotangents gy; adds to gx and gtheta (of the whole model), each may be NULL. */
static void backward(const struct latent *m, int k, int planes, const pass *p, roln_real *gx, roln_real *gtheta)
{
    roln_mlp_plane plane[3];
    int t;
    for (t = 0; t < planes; t++) { /* each from a call of its own */
        const roln_mlp_plane own = {p->x[k] + t * m->net[k].size[0], p->out[k] + t * 2 * HIDDEN, 1, 0};
        plane[t] = own;
    }
    roln_mlp_bwd(&m->net[k], planes, 1, m->theta + m->at[k], plane, p->slope[k], p->gy[k], gx, gtheta ? gtheta + m->at[k] : NULL,
                 p->work);
}

/* g [in] = gradient of the last output by the input; with SYMODEN's triangles, of what gy holds. */
static void input_gradient(const struct latent *m, int k, const pass *p)
{
    memset(p->g[k], 0, (size_t)m->net[k].size[0] * sizeof *p->g[k]);
    backward(m, k, 1, p, p->g[k], NULL);
}

/* Plane t of gy: c for the last output, 0 for the others. */
static void last_output(const struct latent *m, int k, int t, const pass *p, roln_real c)
{
    const int out = m->net[k].size[m->net[k].layers];
    memset(p->gy[k] + t * out, 0, (size_t)out * sizeof *p->gy[k]);
    p->gy[k][(t + 1) * out - 1] = c;
}

static void slope(const struct latent *m, int k, const pass *p)
{
    forward(m, k, 0, p);
    last_output(m, k, 0, p, 1);
    input_gradient(m, k, p);
}

/* Of c <lambda, slope> + <gy, outputs>: lambda is plane 1 of x, <lambda, slope> the derivative in that direction. */
static void slope_bwd(const struct latent *m, int k, const pass *p, roln_real c, roln_real *gtheta)
{
    forward(m, k, 1, p);
    last_output(m, k, 1, p, c);
    backward(m, k, 2, p, p->gx[k], gtheta);
}

/* y = L x, y = L^T x; G += a b^T. */
static void mul(int n, const roln_real *L, const roln_real *x, roln_real *y)
{
    roln_mm_bt(1, n, n, x, L, y);
}

static void mul_t(int n, const roln_real *L, const roln_real *x, roln_real *y)
{
    roln_mm(1, n, n, x, L, y);
}

static void outer(int n, const roln_real *a, const roln_real *b, roln_real *G)
{
    roln_mm_at(n, 1, n, a, b, G);
}

/* ---- dissipative SymODEN ----

   With W' = DW[zd], d/dt (W p) is
       zdd = W' p + W f,   f = p' = tau - 1/2 grad_z (p^T W p) - grad V - D zd,   p = W^-1 zd,
       W = L L^T + LEAST I,   W' = L' L^T + L L'^T,   D = R R^T. */

static roln_status symoden(const struct latent *m, const roln_real *s, const roln_real *tau, const pass *p)
{
    const int n = m->n, nn = n * n, tri = ROLN_TRI(n);
    roln_real *a = p->row, *b = a + n, *h = b + n, *W = h + n, *rate = p->rate;
    const roln_real *zd = s + n;
    roln_status st;
    int i, k;
    for (k = 0; k < NETS; k++)
        memcpy(p->x[k], s, (size_t)n * sizeof *s);
    memcpy(p->x[0] + n, zd, (size_t)n * sizeof *s);
    forward(m, 0, 0, p), forward(m, 0, 1, p), forward(m, 2, 0, p);
    slope(m, 1, p);
    rolni_low(n, p->y[0], p->L), rolni_low(n, p->y[0] + tri, p->L1), rolni_low(n, p->y[2], p->R);
    roln_mm_bt(n, n, n, p->L, p->L, p->C);
    for (i = 0; i < n; i++)
        p->C[i * n + i] += LEAST;
    if ((st = roln_chol(n, p->C, p->C)) != ROLN_OK) return st;
    roln_solve_lower(n, p->C, zd, p->p);
    roln_solve_lower_t(n, p->C, p->p, p->p);
    mul_t(n, p->L, p->p, a); /* the cotangent p (L^T p)^T of L in 1/2 p^T W p */
    memset(W, 0, (size_t)nn * sizeof *W);
    outer(n, p->p, a, W);
    rolni_tri_bwd(n, 1, 1, W, p->gy[0]);
    input_gradient(m, 0, p);
    mul_t(n, p->R, zd, a); /* zdd = L' L^T p + L (L'^T p + L^T f) + LEAST f */
    mul(n, p->R, a, b);
    for (i = 0; i < n; i++)
        p->f[i] = (tau ? tau[i] : 0) - p->g[0][i] - p->g[1][i] - b[i];
    mul_t(n, p->L1, p->p, b);
    mul_t(n, p->L, p->f, h);
    for (i = 0; i < n; i++)
        b[i] += h[i];
    mul(n, p->L, b, rate + n);
    mul_t(n, p->L, p->p, a);
    mul(n, p->L1, a, b);
    for (i = 0; i < n; i++) {
        rate[i] = zd[i];
        rate[n + i] += b[i] + LEAST * p->f[i];
    }
    return ROLN_OK;
}

/* The cotangent y of zdd. mu = W y is that of f, hence of -D zd and, as directional derivatives, of the two gradients:
       L = .. - grad V . mu - 1/2 p^T W" p,   W" = DW[mu];   nu = W^-1 (W' y - W" p) is that of zd = W p. */
static void symoden_bwd(const struct latent *m, const roln_real *s, const roln_real *y, const pass *p, roln_real *gtheta)
{
    const int n = m->n, nn = n * n, tri = ROLN_TRI(n);
    const roln_real *L = p->L, *L1 = p->L1, *R = p->R, *zd = s + n, *pr = p->p;
    roln_real *a = p->row, *b = a + n, *c = b + n, *q = c + n, *d = q + n, *h = d + n, *u = h + n, *v = u + n, *nu = p->nu;
    roln_real *L2 = v + n, *G = L2 + nn, *mu = p->x[1] + n;
    int i;
    mul_t(n, L, y, q);
    mul(n, L, q, mu);
    for (i = 0; i < n; i++)
        mu[i] += LEAST * y[i];
    memcpy(p->x[0] + 2 * n, mu, (size_t)n * sizeof *mu);
    forward(m, 0, 2, p);
    last_output(m, 1, 0, p, 0);
    slope_bwd(m, 1, p, -1, gtheta);
    rolni_low(n, p->y[0] + 2 * tri, L2);
    mul_t(n, L, pr, a), mul_t(n, L1, pr, b), mul_t(n, L2, pr, c);
    mul_t(n, L1, y, d), mul_t(n, L, p->f, h);
    mul(n, L1, q, nu); /* W' y = L' q + L d,  W" p = L" a + L c */
    mul(n, L2, a, u);
    for (i = 0; i < n; i++)
        nu[i] -= u[i], u[i] = d[i] - c[i];
    mul(n, L, u, v);
    for (i = 0; i < n; i++)
        nu[i] += v[i];
    roln_solve_lower(n, p->C, nu, nu);
    roln_solve_lower_t(n, p->C, nu, nu);
    mul_t(n, L, nu, v);
    for (i = 0; i < n; i++)
        h[i] += b[i], u[i] -= v[i], nu[i] = -nu[i];
    memset(G, 0, (size_t)nn * sizeof *G); /* L: y (L^T f + L'^T p)^T + f q^T - nu a^T + p (d - c - L^T nu)^T */
    outer(n, y, h, G), outer(n, p->f, q, G), outer(n, nu, a, G), outer(n, pr, u, G);
    rolni_tri_bwd(n, 1, 1, G, p->gy[0]);
    memset(G, 0, (size_t)nn * sizeof *G); /* L': y a^T + p q^T */
    outer(n, y, a, G), outer(n, pr, q, G);
    rolni_tri_bwd(n, 1, 1, G, p->gy[0] + tri);
    memset(G, 0, (size_t)nn * sizeof *G); /* L": -p a^T */
    outer(n, pr, a, G);
    rolni_tri_bwd(n, -1, -1, G, p->gy[0] + 2 * tri);
    mul_t(n, R, zd, a), mul_t(n, R, mu, b);
    memset(G, 0, (size_t)nn * sizeof *G); /* R: -mu (R^T zd)^T - zd (R^T mu)^T */
    outer(n, mu, a, G), outer(n, zd, b, G);
    rolni_tri_bwd(n, -1, -1, G, p->gy[2]);
    backward(m, 0, 3, p, p->gx[0], gtheta);
    backward(m, 2, 1, p, p->gx[2], gtheta);
    mul(n, R, b, v);
    for (i = 0; i < n; i++) /* of zd: as p, and as what D brakes */
        nu[i] = -nu[i] - v[i];
}

/* ---- all kinds ---- */

/* rate = F(s, tau), s [2n], tau [n] or NULL. */
static roln_status evaluate(const struct latent *m, const roln_real *s, const roln_real *tau, const pass *p)
{
    const int n = m->n, n2 = 2 * n, in = m->net[0].size[0];
    roln_real *rate = p->rate;
    const roln_real *g = p->g[0];
    int i, k;
    if (m->kind == LATENT_SYMODEN) return symoden(m, s, tau, p);
    for (k = 0; k < m->nets; k++) {
        memcpy(p->x[k], s, (size_t)n2 * sizeof *s);
        for (i = n2; i < in; i++)
            p->x[k][i] = tau ? tau[i - n2] : 0;
        if (m->kind == LATENT_MLP) forward(m, k, 0, p);
        else slope(m, k, p);
    }
    if (m->kind == LATENT_COMET) {
        const roln_real *s0 = p->y[0], a = roln_dot(n2, g, s0) / (roln_dot(n2, g, g) + ROLN_C(1e-30));
        for (i = 0; i < n2; i++)
            rate[i] = s0[i] - a * g[i];
        return ROLN_OK;
    }
    for (i = 0; i < n; i++) {
        rate[i] = m->kind == LATENT_MLP ? s[n + i] : g[n + i];
        rate[n + i] = m->kind == LATENT_MLP ? p->y[0][i] : (tau ? tau[i] : 0) - g[i];
    }
    for (i = 0; m->kind == LATENT_DHNN && i < n2; i++)
        rate[i] += p->g[1][i];
    return ROLN_OK;
}

/* s' = s_0 - a g, g = grad c, a = g . s_0 / g . g. */
static void comet_bwd(const struct latent *m, const roln_real *y, const pass *p, roln_real *gtheta)
{
    const int n2 = 2 * m->n, in = m->net[0].size[0];
    const roln_real *g = p->g[0], *s0 = p->y[0], gg = roln_dot(n2, g, g) + ROLN_C(1e-30);
    const roln_real a = roln_dot(n2, g, s0) / gg, b = roln_dot(n2, y, g) / gg;
    roln_real *g0 = p->gy[0], *lambda = p->x[0] + in;
    int i;
    memset(lambda, 0, (size_t)in * sizeof *lambda);
    g0[n2] = 0;
    for (i = 0; i < n2; i++) {
        g0[i] = y[i] - b * g[i];
        lambda[i] = -a * y[i] - b * (s0[i] - 2 * a * g[i]);
    }
    slope_bwd(m, 0, p, 1, gtheta);
}

/* Backward of evaluate: adds to gtheta unless NULL; gs [2n]. */
static void evaluate_bwd(const struct latent *m, const roln_real *s, const roln_real *bar, const pass *p, roln_real *gs,
                         roln_real *gtheta)
{
    const int n = m->n, n2 = 2 * n, moves = m->kind == LATENT_MLP || m->kind == LATENT_SYMODEN; /* z' = zd */
    int i, k;
    for (k = 0; k < m->nets; k++)
        memset(p->gx[k], 0, (size_t)((1 + m->T[k]) * m->net[k].size[0]) * sizeof *p->gx[k]);
    if (m->kind == LATENT_COMET) comet_bwd(m, bar, p, gtheta);
    if (m->kind == LATENT_SYMODEN) symoden_bwd(m, s, bar + n, p, gtheta);
    if (m->kind == LATENT_MLP) {
        memcpy(p->gy[0], bar + n, (size_t)n * sizeof *bar);
        backward(m, 0, 1, p, p->gx[0], gtheta);
    }
    if (m->kind == LATENT_HNN || m->kind == LATENT_DHNN) { /* <bar, J grad H> = <-J bar, grad H> */
        for (i = 0; i < n; i++)
            p->x[0][n2 + i] = -bar[n + i], p->x[0][n2 + n + i] = bar[i];
        if (m->kind == LATENT_DHNN) memcpy(p->x[1] + n2, bar, (size_t)n2 * sizeof *bar);
        for (k = 0; k < m->nets; k++) {
            last_output(m, k, 0, p, 0);
            slope_bwd(m, k, p, 1, gtheta);
        }
    }
    for (i = 0; i < n; i++) {
        gs[i] = p->gx[0][i] + (m->nets > 1 ? p->gx[1][i] : 0) + (m->nets > 2 ? p->gx[2][i] : 0);
        gs[n + i] = (moves ? bar[i] : 0) + p->gx[0][n + i] + (m->kind == LATENT_DHNN ? p->gx[1][n + i] : 0) +
                    (m->kind == LATENT_SYMODEN ? p->nu[i] : 0);
    }
}

/* ---- to use ---- */

struct latent *latent_new(enum latent_kind kind, int n, int forced, double steep, uint64_t seed)
{
    struct latent m, *new;
    if ((int)kind < 0 || kind >= LATENT_KINDS || n < 1 || n > N_MAX) return NULL;
    m = shape(kind, n, forced);
    new = malloc(sizeof m + (size_t)latent_params(&m) * sizeof *m.theta);
    if (!new) return NULL;
    memcpy(new, &m, sizeof m);
    init(new, steep, &seed);
    return new;
}

void latent_free(struct latent *m)
{
    free(m);
}

int latent_params(const struct latent *m)
{
    return m->at[m->nets];
}

roln_real *latent_theta(struct latent *m)
{
    return m->theta;
}

roln_status latent_rate(const struct latent *m, const roln_real *s, const roln_real *tau_z, roln_real *sd)
{
    roln_real mem[ROW];
    const pass p = pass_of(m, mem);
    const roln_status st = evaluate(m, s, tau_z, &p);
    if (st != ROLN_OK) return st;
    if (!roln_all_finite(2 * m->n, p.rate)) return ROLN_E_NOT_FINITE;
    memcpy(sd, p.rate, (size_t)(2 * m->n) * sizeof *sd);
    return ROLN_OK;
}

roln_status latent_bwd(const struct latent *m, const roln_real *s, const roln_real *tau_z, const roln_real *bar, roln_real *gs,
                       roln_real *gtheta)
{
    roln_real mem[ROW];
    const pass p = pass_of(m, mem);
    const roln_status st = evaluate(m, s, tau_z, &p);
    if (st == ROLN_OK) evaluate_bwd(m, s, bar, &p, gs, gtheta);
    return st;
}

/* COMET's loss is |s' - sd|^2 + |s_0 - sd|^2 + 2n (grad c . s_0)^2, the last, which shall make the projection superfluous, at a
   state with noise. */
roln_real latent_extra(const struct latent *m, const roln_real *s, const roln_real *tau_z, const roln_real *sd, uint64_t *signs,
                       roln_real *gtheta)
{
    const int n2 = 2 * m->n, in = m->net[0].size[0];
    roln_real mem[ROW], near[2 * N_MAX], sum = 0;
    const pass p = pass_of(m, mem);
    if (m->kind != LATENT_COMET || evaluate(m, s, tau_z, &p) != ROLN_OK) return 0;
    p.gy[0][n2] = 0;
    for (int i = 0; i < n2; i++) {
        p.gy[0][i] = roln_rand(signs) >> 63 ? ROLN_C(1.0) : ROLN_C(-1.0);
        sum += p.gy[0][i] * (p.y[0][i] - sd[i]);
        near[i] = s[i] + JITTER * roln_normal(signs);
    }
    if (gtheta) backward(m, 0, 1, &p, NULL, gtheta);
    if (evaluate(m, near, tau_z, &p) != ROLN_OK) return sum;
    const roln_real c = ROLN_SQRT((roln_real)n2) * (roln_rand(signs) >> 63 ? 1 : -1);
    memset(p.x[0] + in, 0, (size_t)in * sizeof *p.x[0]);
    memset(p.gx[0], 0, (size_t)(2 * in) * sizeof *p.gx[0]);
    for (int i = 0; i < n2; i++)
        p.gy[0][i] = c * p.g[0][i], p.x[0][in + i] = c * p.y[0][i];
    sum += c * roln_dot(n2, p.g[0], p.y[0]);
    p.gy[0][n2] = 0;
    if (gtheta) slope_bwd(m, 0, &p, 1, gtheta);
    return sum;
}

/* H. COMET's c is constant along a motion like any function of it, and has no unit: no energy. */
int latent_energy(const struct latent *m, const roln_real *s, double *E)
{
    roln_real mem[ROW];
    const pass p = pass_of(m, mem);
    if (m->kind == LATENT_MLP || m->kind == LATENT_COMET || evaluate(m, s, NULL, &p) != ROLN_OK) return 0;
    *E = m->kind == LATENT_SYMODEN ? (double)(roln_dot(m->n, p.p, s + m->n) / 2 + p.y[1][0]) : (double)p.y[0][0];
    return 1;
}
