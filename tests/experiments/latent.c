/* latent.c - other models of the motion of z: s = [z; zd], s' = F(s, tau_z), from samples of s', with networks of the same
   size and the same loss for all, |s' predicted - s'|^2. A, B, V, D, .. are networks, p a momentum:

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

enum { N_MAX = 16, HIDDEN = 64, NETS = 3, BLOCK = 16, WARMUP = 100, REFUSED = 1000 };

#define LEAST ROLN_C(1e-4) /* W = L L^T + LEAST I */
#define JITTER ROLN_C(0.1) /* COMET's regulariser sees states with this much noise */

struct latent {
    enum latent_kind kind;
    int n, force;           /* force: tau is an input of the network */
    int nets, T[NETS];      /* networks; tangent planes that each needs */
    int at[NETS + 1];       /* where each begins in theta, and its end */
    roln_mlp net[NETS];     /* SYMODEN: L of W, V, L of D */
    roln_real theta[];
};

/* What a pass over nb rows keeps. */
typedef struct {
    int size;                                                   /* numbers in all */
    roln_real *x[NETS], *y[NETS], *gy[NETS];                    /* of each network [1+T][nb][in], .. [out] */
    roln_real *slope[NETS], *out[NETS];                         /* [nb * 2 HIDDEN], [1+T][nb * 2 HIDDEN]: roln_mlp_forward */
    roln_real *g[NETS];                                         /* [nb][in] a gradient by its input */
    roln_real *rate, *bar;                                      /* [nb][2n] s', and its cotangent */
    roln_real *L, *L1, *R, *C;                                  /* SYMODEN [nb][n][n]: L, DL[zd], L of D, W = C C^T */
    roln_real *p, *f;                                           /* SYMODEN [nb][n]: p, p' */
    roln_real *row, *work;
} pass;

/* ---- memory ---- */

enum { ROW = 4608 }; /* numbers in a pass over one row, at most */

static roln_real *take(roln_real *mem, int *at, int size)
{
    roln_real *p = mem ? mem + *at : NULL;
    *at += size;
    return p;
}

static pass pass_of(const struct latent *m, int nb, roln_real *mem)
{
    const int n = m->n, nn = m->kind == LATENT_SYMODEN ? n * n : 0;
    pass p = {0};
    int k;
    for (k = 0; k < m->nets; k++) {
        const int in = m->net[k].size[0], out = m->net[k].size[m->net[k].layers], T = m->T[k];
        p.x[k] = take(mem, &p.size, (1 + T) * nb * in);
        p.y[k] = take(mem, &p.size, (1 + T) * nb * out);
        p.gy[k] = take(mem, &p.size, (1 + T) * nb * out);
        p.slope[k] = take(mem, &p.size, nb * 2 * HIDDEN);
        p.out[k] = take(mem, &p.size, (1 + T) * nb * 2 * HIDDEN);
        p.g[k] = take(mem, &p.size, nb * in);
    }
    p.rate = take(mem, &p.size, 2 * nb * n);
    p.bar = take(mem, &p.size, 2 * nb * n);
    p.L = take(mem, &p.size, nb * nn);
    p.L1 = take(mem, &p.size, nb * nn);
    p.R = take(mem, &p.size, nb * nn);
    p.C = take(mem, &p.size, nb * nn);
    p.p = take(mem, &p.size, nb * n);
    p.f = take(mem, &p.size, nb * n);
    p.row = take(mem, &p.size, 2 * nn + 9 * n);
    p.work = take(mem, &p.size, ROLN_MLP_BWD_WORK(1 + m->T[0], nb, 2 * HIDDEN));
    return p;
}

/* ---- networks ---- */

static void add_net(struct latent *m, int T, int in, int out)
{
    const roln_mlp f = {3, {in, HIDDEN, HIDDEN, out}};
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

/* SYMODEN begins with W near I and D near 0. */
static void init(struct latent *m, uint64_t *seed)
{
    const int triangles = m->kind == LATENT_SYMODEN;
    int k, i;
    for (k = 0; k < m->nets; k++)
        roln_mlp_init(&m->net[k], triangles && k != 1 ? ROLN_C(0.1) : 1, m->theta + m->at[k], seed);
    for (i = 0; triangles && i < m->n; i++)
        m->theta[m->at[1] - ROLN_TRI(m->n) + i] = 1;
}

/* Plane t, after plane 0: 0 the outputs, 1 .. their derivatives along plane t of x. */
static void forward(const struct latent *m, int k, int t, int nb, const pass *p)
{
    const roln_mlp *f = &m->net[k];
    roln_mlp_forward(f, t == 0, 1, nb, m->theta + m->at[k], p->x[k] + t * nb * f->size[0], p->y[k] + t * nb * f->size[f->layers],
                     p->slope[k], p->out[k] + t * nb * 2 * HIDDEN);
}

/* Backward of planes 0 .. planes-1 with the cotangents gy; gx, gtheta (of the whole model) may be NULL. */
static void backward(const struct latent *m, int k, int planes, int nb, const pass *p, roln_real *gx, roln_real *gtheta)
{
    roln_mlp_plane plane[3];
    int t;
    for (t = 0; t < planes; t++) { /* each from a call of its own */
        const roln_mlp_plane own = {p->x[k] + t * nb * m->net[k].size[0], p->out[k] + t * nb * 2 * HIDDEN, 1, 0};
        plane[t] = own;
    }
    roln_mlp_bwd(&m->net[k], planes, nb, m->theta + m->at[k], plane, p->slope[k], p->gy[k], gx,
                 gtheta ? gtheta + m->at[k] : NULL, p->work);
}

/* g [nb][in] = gradient of the last output by the input; with SYMODEN's triangles, of what gy holds. */
static void input_gradient(const struct latent *m, int k, int nb, const pass *p)
{
    memset(p->g[k], 0, (size_t)(nb * m->net[k].size[0]) * sizeof *p->g[k]);
    backward(m, k, 1, nb, p, p->g[k], NULL);
}

/* Plane t of gy: c for the last output, 0 for the others. */
static void last_output(const struct latent *m, int k, int t, int nb, const pass *p, roln_real c)
{
    const int out = m->net[k].size[m->net[k].layers];
    roln_real *gy = p->gy[k] + t * nb * out;
    int i;
    for (i = 0; i < nb * out; i++)
        gy[i] = (i + 1) % out == 0 ? c : 0;
}

static void slope(const struct latent *m, int k, int nb, const pass *p)
{
    forward(m, k, 0, nb, p);
    last_output(m, k, 0, nb, p, 1);
    input_gradient(m, k, nb, p);
}

/* gtheta of c <lambda, slope> + <gy, outputs>: lambda is plane 1 of x, <lambda, slope> the derivative in that direction. */
static void slope_bwd(const struct latent *m, int k, int nb, const pass *p, roln_real c, roln_real *gtheta)
{
    forward(m, k, 1, nb, p);
    last_output(m, k, 1, nb, p, c);
    backward(m, k, 2, nb, p, NULL, gtheta);
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

static roln_status symoden(const struct latent *m, int nb, const roln_real *s, const roln_real *tau, const pass *p)
{
    const int n = m->n, nn = n * n, tri = ROLN_TRI(n);
    roln_real *a = p->row, *b = a + n, *h = b + n, *W = h + n;
    int r, i, k;
    for (r = 0; r < nb; r++) {
        for (k = 0; k < NETS; k++)
            memcpy(p->x[k] + r * n, s + 2 * r * n, (size_t)n * sizeof *s);
        memcpy(p->x[0] + (nb + r) * n, s + (2 * r + 1) * n, (size_t)n * sizeof *s);
    }
    forward(m, 0, 0, nb, p);
    forward(m, 0, 1, nb, p);
    forward(m, 2, 0, nb, p);
    slope(m, 1, nb, p);
    for (r = 0; r < nb; r++) { /* p; the cotangent p (L^T p)^T of L in 1/2 p^T W p */
        const roln_real *zd = s + (2 * r + 1) * n;
        roln_real *L = p->L + r * nn, *C = p->C + r * nn, *pr = p->p + r * n;
        roln_status st;
        rolni_low(n, p->y[0] + r * tri, L);
        rolni_low(n, p->y[0] + (nb + r) * tri, p->L1 + r * nn);
        rolni_low(n, p->y[2] + r * tri, p->R + r * nn);
        roln_mm_bt(n, n, n, L, L, C);
        for (i = 0; i < n; i++)
            C[i * n + i] += LEAST;
        if ((st = roln_chol(n, C, C)) != ROLN_OK) return st;
        roln_solve_lower(n, C, zd, pr);
        roln_solve_lower_t(n, C, pr, pr);
        mul_t(n, L, pr, a);
        memset(W, 0, (size_t)nn * sizeof *W);
        outer(n, pr, a, W);
        rolni_tri_bwd(n, 1, 1, W, p->gy[0] + r * tri);
    }
    input_gradient(m, 0, nb, p);
    for (r = 0; r < nb; r++) { /* zdd = L' L^T p + L (L'^T p + L^T f) + LEAST f */
        const roln_real *zd = s + (2 * r + 1) * n, *L = p->L + r * nn, *L1 = p->L1 + r * nn, *R = p->R + r * nn;
        roln_real *f = p->f + r * n, *rate = p->rate + 2 * r * n;
        mul_t(n, R, zd, a);
        mul(n, R, a, b);
        for (i = 0; i < n; i++)
            f[i] = (tau ? tau[r * n + i] : 0) - p->g[0][r * n + i] - p->g[1][r * n + i] - b[i];
        mul_t(n, L1, p->p + r * n, b);
        mul_t(n, L, f, h);
        for (i = 0; i < n; i++)
            b[i] += h[i];
        mul(n, L, b, rate + n);
        mul_t(n, L, p->p + r * n, a);
        mul(n, L1, a, b);
        for (i = 0; i < n; i++) {
            rate[i] = zd[i];
            rate[n + i] += b[i] + LEAST * f[i];
        }
    }
    return ROLN_OK;
}

/* The cotangent y of zdd. mu = W y is that of f, hence of -D zd and, as directional derivatives, of the two gradients:
       L = .. - grad V . mu - 1/2 p^T W" p,   W" = DW[mu];   nu = W^-1 (W' y - W" p) is that of zd = W p. */
static void symoden_bwd(const struct latent *m, int nb, const roln_real *s, const pass *p, roln_real *gtheta)
{
    const int n = m->n, nn = n * n, tri = ROLN_TRI(n);
    roln_real *a = p->row, *b = a + n, *c = b + n, *q = c + n, *d = q + n, *h = d + n, *u = h + n, *nu = u + n, *v = nu + n;
    roln_real *L2 = v + n, *G = L2 + nn;
    int r, i;
    for (r = 0; r < nb; r++) {
        const roln_real *L = p->L + r * nn, *y = p->bar + (2 * r + 1) * n;
        roln_real *mu = p->x[1] + (nb + r) * n;
        mul_t(n, L, y, q);
        mul(n, L, q, mu);
        for (i = 0; i < n; i++)
            mu[i] += LEAST * y[i];
        memcpy(p->x[0] + (2 * nb + r) * n, mu, (size_t)n * sizeof *mu);
    }
    forward(m, 0, 2, nb, p);
    last_output(m, 1, 0, nb, p, 0);
    slope_bwd(m, 1, nb, p, -1, gtheta);
    for (r = 0; r < nb; r++) {
        const roln_real *L = p->L + r * nn, *L1 = p->L1 + r * nn, *R = p->R + r * nn, *C = p->C + r * nn, *f = p->f + r * n;
        const roln_real *y = p->bar + (2 * r + 1) * n, *zd = s + (2 * r + 1) * n, *mu = p->x[1] + (nb + r) * n, *pr = p->p + r * n;
        rolni_low(n, p->y[0] + (2 * nb + r) * tri, L2);
        mul_t(n, L, pr, a), mul_t(n, L1, pr, b), mul_t(n, L2, pr, c);
        mul_t(n, L, y, q), mul_t(n, L1, y, d), mul_t(n, L, f, h);
        mul(n, L1, q, nu); /* W' y = L' q + L d,  W" p = L" a + L c */
        mul(n, L2, a, u);
        for (i = 0; i < n; i++)
            nu[i] -= u[i], u[i] = d[i] - c[i];
        mul(n, L, u, v);
        for (i = 0; i < n; i++)
            nu[i] += v[i];
        roln_solve_lower(n, C, nu, nu);
        roln_solve_lower_t(n, C, nu, nu);
        mul_t(n, L, nu, v);
        for (i = 0; i < n; i++)
            h[i] += b[i], u[i] -= v[i], nu[i] = -nu[i];
        memset(G, 0, (size_t)nn * sizeof *G); /* L: y (L^T f + L'^T p)^T + f q^T - nu a^T + p (d - c - L^T nu)^T */
        outer(n, y, h, G), outer(n, f, q, G), outer(n, nu, a, G), outer(n, pr, u, G);
        rolni_tri_bwd(n, 1, 1, G, p->gy[0] + r * tri);
        memset(G, 0, (size_t)nn * sizeof *G); /* L': y a^T + p q^T */
        outer(n, y, a, G), outer(n, pr, q, G);
        rolni_tri_bwd(n, 1, 1, G, p->gy[0] + (nb + r) * tri);
        memset(G, 0, (size_t)nn * sizeof *G); /* L": -p a^T */
        outer(n, pr, a, G);
        rolni_tri_bwd(n, -1, -1, G, p->gy[0] + (2 * nb + r) * tri);
        mul_t(n, R, zd, a), mul_t(n, R, mu, b);
        memset(G, 0, (size_t)nn * sizeof *G); /* R: -mu (R^T zd)^T - zd (R^T mu)^T */
        outer(n, mu, a, G), outer(n, zd, b, G);
        rolni_tri_bwd(n, -1, -1, G, p->gy[2] + r * tri);
    }
    backward(m, 0, 3, nb, p, NULL, gtheta);
    backward(m, 2, 1, nb, p, NULL, gtheta);
}

/* ---- all kinds ---- */

/* rate = F(s, tau), s [nb][2n], tau [nb][n] or NULL. */
static roln_status evaluate(const struct latent *m, int nb, const roln_real *s, const roln_real *tau, const pass *p)
{
    const int n = m->n, n2 = 2 * n, in = m->net[0].size[0];
    int r, i, k;
    if (m->kind == LATENT_SYMODEN) return symoden(m, nb, s, tau, p);
    for (k = 0; k < m->nets; k++) {
        for (r = 0; r < nb; r++) {
            roln_real *x = p->x[k] + r * in;
            memcpy(x, s + r * n2, (size_t)n2 * sizeof *s);
            for (i = n2; i < in; i++)
                x[i] = tau ? tau[r * n + i - n2] : 0;
        }
        if (m->kind == LATENT_MLP) forward(m, k, 0, nb, p);
        else slope(m, k, nb, p);
    }
    for (r = 0; r < nb; r++) {
        const roln_real *g = p->g[0] + r * in;
        roln_real *rate = p->rate + r * n2;
        if (m->kind == LATENT_COMET) {
            const roln_real *s0 = p->y[0] + r * (n2 + 1), a = roln_dot(n2, g, s0) / (roln_dot(n2, g, g) + ROLN_C(1e-30));
            for (i = 0; i < n2; i++)
                rate[i] = s0[i] - a * g[i];
            continue;
        }
        for (i = 0; i < n; i++) {
            rate[i] = m->kind == LATENT_MLP ? s[r * n2 + n + i] : g[n + i];
            rate[n + i] = m->kind == LATENT_MLP ? p->y[0][r * n + i] : (tau ? tau[r * n + i] : 0) - g[i];
        }
        for (i = 0; m->kind == LATENT_DHNN && i < n2; i++)
            rate[i] += p->g[1][r * n2 + i];
    }
    return ROLN_OK;
}

/* COMET's loss |s' - sd|^2 + |s_0 - sd|^2 + 2n (grad c . s_0)^2, the first two of the first half of the rows, the last, which
   shall make the projection superfluous, of the second. Returns what it adds to the first term. */
static double comet_bwd(const struct latent *m, int nb, const roln_real *sd, const pass *p, roln_real *gtheta)
{
    const int n2 = 2 * m->n, in = m->net[0].size[0];
    double loss = 0;
    int r, i;
    for (r = 0; r < nb; r++) {
        const roln_real *g = p->g[0] + r * in, *s0 = p->y[0] + r * (n2 + 1), *y = p->bar + r * n2;
        const roln_real gs = roln_dot(n2, g, s0), gg = roln_dot(n2, g, g) + ROLN_C(1e-30), a = gs / gg;
        roln_real *g0 = p->gy[0] + r * (n2 + 1), *lambda = p->x[0] + (nb + r) * in;
        memset(lambda, 0, (size_t)in * sizeof *lambda);
        g0[n2] = 0;
        if (r < nb / 2) { /* s' = s_0 - a g */
            const roln_real b = roln_dot(n2, y, g) / gg;
            for (i = 0; i < n2; i++) {
                const roln_real e = s0[i] - sd[r * n2 + i];
                g0[i] = y[i] - b * g[i] + 2 * e;
                lambda[i] = -a * y[i] - b * (s0[i] - 2 * a * g[i]);
                loss += (double)e * (double)e;
            }
        } else {
            const roln_real b = (roln_real)(2 * n2) * gs;
            for (i = 0; i < n2; i++)
                g0[i] = b * g[i], lambda[i] = b * s0[i];
            loss += n2 * (double)gs * (double)gs;
        }
    }
    slope_bwd(m, 0, nb, p, 1, gtheta);
    return loss;
}

/* Adds to gtheta and *loss the sums over nb samples: s [2 nb][2n] and tau [2 nb][n] or NULL, of which COMET writes the second
   half, states with noise; sd [nb][2n]. */
static roln_status gradient(const struct latent *m, int nb, roln_real *s, const roln_real *sd, roln_real *tau,
                            uint64_t *seed, roln_real *gtheta, double *loss, const pass *p)
{
    const int n = m->n, n2 = 2 * n, comet = m->kind == LATENT_COMET, rows = comet ? 2 * nb : nb;
    roln_status st;
    int r, i, k;
    for (i = 0; comet && i < nb * n2; i++)
        s[nb * n2 + i] = s[i] + JITTER * roln_normal(seed);
    if (comet && tau) memcpy(tau + nb * n, tau, (size_t)(nb * n) * sizeof *tau);
    if ((st = evaluate(m, rows, s, tau, p)) != ROLN_OK) return st;
    for (i = 0; i < nb * n2; i++) {
        const roln_real e = p->rate[i] - sd[i];
        p->bar[i] = 2 * e;
        *loss += (double)e * (double)e;
    }
    if (comet) {
        *loss += comet_bwd(m, rows, sd, p, gtheta);
    } else if (m->kind == LATENT_SYMODEN) {
        symoden_bwd(m, nb, s, p, gtheta);
    } else if (m->kind == LATENT_MLP) {
        for (r = 0; r < nb; r++)
            memcpy(p->gy[0] + r * n, p->bar + r * n2 + n, (size_t)n * sizeof *sd);
        backward(m, 0, 1, nb, p, NULL, gtheta);
    } else {
        for (r = 0; r < nb; r++) /* <bar, J grad H> = <-J bar, grad H> */
            for (i = 0; i < n; i++) {
                p->x[0][(nb + r) * n2 + i] = -p->bar[r * n2 + n + i];
                p->x[0][(nb + r) * n2 + n + i] = p->bar[r * n2 + i];
            }
        if (m->kind == LATENT_DHNN) memcpy(p->x[1] + nb * n2, p->bar, (size_t)(nb * n2) * sizeof *sd);
        for (k = 0; k < m->nets; k++) {
            last_output(m, k, 0, nb, p, 0);
            slope_bwd(m, k, nb, p, 1, gtheta);
        }
    }
    return ROLN_OK;
}

/* ---- training ---- */

static int refuse(const char *reason)
{
    fprintf(stderr, "latent: %s\n", reason);
    return -1;
}

/* Gradient of one batch. */
static roln_status batch_gradient(const struct latent *m, const struct latent_data *d, const int *index, int batch,
                                  uint64_t *seed, roln_real *gtheta, roln_real *rows, const pass *p)
{
    const int n = m->n;
    const size_t bytes = (size_t)n * sizeof *rows;
    roln_real *s = rows, *sd = s + 4 * BLOCK * n, *tau = d->tau_z ? sd + 2 * BLOCK * n : NULL;
    roln_status st = ROLN_OK;
    double loss = 0;
    int at, r;
    for (at = 0; at < batch && st == ROLN_OK; at += BLOCK) {
        const int nb = batch - at < BLOCK ? batch - at : BLOCK;
        for (r = 0; r < nb; r++) {
            const size_t i = (size_t)index[at + r] * (size_t)n;
            memcpy(s + 2 * r * n, d->z + i, bytes);
            memcpy(s + (2 * r + 1) * n, d->zd + i, bytes);
            memcpy(sd + 2 * r * n, d->zd + i, bytes);
            memcpy(sd + (2 * r + 1) * n, d->zdd + i, bytes);
            if (tau) memcpy(tau + r * n, d->tau_z + i, bytes);
        }
        st = gradient(m, nb, s, sd, tau, seed, gtheta, &loss, p);
    }
    return st;
}

/* Updates that would leave NaN or a W that is not positive definite are left out, as in examples/train.c. */
static int run(struct latent *m, const struct latent_data *d, int updates, int batch, double rate, uint64_t *seed, int *index,
               roln_real *mem)
{
    const int params = latent_params(m);
    const roln_block block = {ROLN_EUCLIDEAN, params, 1, 1};
    roln_real *g = mem, *m1 = g + params, *m2 = m1 + params, *top = m2 + params, *rows = top + params;
    const pass p = pass_of(m, 2 * BLOCK, rows + 8 * BLOCK * m->n);
    const roln_moments moments = {m1, m2, top};
    roln_adam adam = {0};
    int t, i, at = d->count, refused = 0;
    memset(mem, 0, (size_t)(4 * params) * sizeof *mem);
    for (i = 0; i < d->count; i++)
        index[i] = i;
    for (t = 0; t < updates; t++) {
        const roln_opt opt = ROLN_OPT(0, (roln_real)rate * roln_schedule((uint32_t)t, WARMUP, (uint32_t)updates, ROLN_C(1e-3)));
        roln_status st;
        if (at + batch > d->count) roln_shuffle(d->count, index, seed), at = 0;
        memset(g, 0, (size_t)params * sizeof *g);
        st = batch_gradient(m, d, index + at, batch, seed, g, rows, &p);
        at += batch;
        if (st == ROLN_OK) st = roln_adam_update(1, &block, &opt, 1 / (roln_real)batch, g, m->theta, &adam, &moments, NULL);
        if (st != ROLN_OK && ++refused > REFUSED) return refuse("too many updates left out");
    }
    if (refused > 0) fprintf(stderr, "latent: %d of %d updates left out\n", refused, updates);
    return 0;
}

int latent_train(struct latent **out, enum latent_kind kind, const struct latent_data *d, int updates, int batch, double rate,
                 uint64_t seed)
{
    struct latent m;
    int params, size, result = -1, *index;
    roln_real *mem;
    *out = NULL;
    if ((int)kind < 0 || kind >= LATENT_KINDS) return refuse("no such kind");
    if (d->n < 1 || d->n > N_MAX) return refuse("n must be 1 .. 16");
    if (batch < 1 || d->count < batch) return refuse("fewer samples than a batch needs");
    m = shape(kind, d->n, d->tau_z != NULL);
    params = latent_params(&m);
    size = 4 * params + 8 * BLOCK * d->n + pass_of(&m, 2 * BLOCK, NULL).size;
    *out = malloc(sizeof m + (size_t)params * sizeof *m.theta);
    mem = malloc((size_t)size * sizeof *mem);
    index = malloc((size_t)d->count * sizeof *index);
    if (*out && mem && index) {
        memcpy(*out, &m, sizeof m);
        init(*out, &seed);
        result = run(*out, d, updates, batch, rate, &seed, index, mem);
    } else {
        refuse("out of memory");
    }
    free(mem);
    free(index);
    if (result != 0) latent_free(*out), *out = NULL;
    return result;
}

void latent_free(struct latent *m)
{
    free(m);
}

int latent_params(const struct latent *m)
{
    return m->at[m->nets];
}

roln_status latent_rate(const struct latent *m, const roln_real *s, const roln_real *tau_z, roln_real *sd)
{
    roln_real mem[ROW];
    const pass p = pass_of(m, 1, mem);
    const roln_status st = evaluate(m, 1, s, tau_z, &p);
    if (st != ROLN_OK) return st;
    if (!roln_all_finite(2 * m->n, p.rate)) return ROLN_E_NOT_FINITE;
    memcpy(sd, p.rate, (size_t)(2 * m->n) * sizeof *sd);
    return ROLN_OK;
}

/* H. COMET's c is constant along a motion like any function of it, and has no unit: no energy. */
int latent_energy(const struct latent *m, const roln_real *s, double *E)
{
    roln_real mem[ROW];
    const pass p = pass_of(m, 1, mem);
    if (m->kind == LATENT_MLP || m->kind == LATENT_COMET || evaluate(m, 1, s, NULL, &p) != ROLN_OK) return 0;
    *E = m->kind == LATENT_SYMODEN ? (double)(roln_dot(m->n, p.p, s + m->n) / 2 + p.y[1][0]) : (double)p.y[0][0];
    return 1;
}
