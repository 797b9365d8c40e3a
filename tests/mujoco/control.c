#include "control.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../examples/pend16.h"
#include "truth.h"

#define PI 3.14159265358979323846
#define DT 1e-3
enum { N = pend16_N, n = pend16_n };

const char *control_name(enum control_law law)
{
    static const char *const names[CONTROL_LAWS] = {"PD", "PD + true gravity", "latent", "PD, 4 motors", "latent, 4 motors"};
    return names[law];
}

/* ---- references ---- */

static double uniform(uint64_t *seed, double low, double high)
{
    return low + (high - low) * (double)roln_uniform(seed);
}

struct control_reference control_reference(uint64_t seed)
{
    struct control_reference r;
    for (int j = 0; j < n; j++) {
        const double size = uniform(&seed, .3, .5);
        double sum = 0;
        for (int k = 0; k < 3; k++) {
            sum += r.amplitude[j][k] = uniform(&seed, .3, 1);
            r.frequency[j][k] = uniform(&seed, .1, .9);
            r.phase[j][k] = uniform(&seed, 0, 2 * PI);
        }
        for (int k = 0; k < 3; k++)
            r.amplitude[j][k] *= size / sum;
    }
    return r;
}

/* r = s(t/2) sum of sines with s = 10 x^3 - 15 x^4 + 6 x^5; q = phi(z), qd = J zd, qdd = J zdd + Jdot zd. */
void control_reference_at(const struct control_reference *r, double t, double q[16], double qd[16], double qdd[16])
{
    const double x = fmin(t / 2, 1), y = 1 - x;
    const double s = x * x * x * (10 + x * (6 * x - 15)), sd = 15 * x * x * y * y, sdd = 15 * x * y * (y - x), h = 1e-5;
    double z[n], zd[n], zdd[n], J[N * n], plus[N * n], minus[N * n], none[N], to[n];
    for (int j = 0; j < n; j++) {
        double f = 0, fd = 0, fdd = 0;
        for (int k = 0; k < 3; k++) {
            const double w = 2 * PI * r->frequency[j][k], a = r->amplitude[j][k], p = w * t + r->phase[j][k];
            f += a * sin(p), fd += a * w * cos(p), fdd -= a * w * w * sin(p);
        }
        z[j] = s * f;
        zd[j] = sd * f + s * fd;
        zdd[j] = sdd * f + 2 * sd * fd + s * fdd;
    }
    truth_pend16_phi(z, q, J);
    for (int j = 0; j < n; j++) to[j] = z[j] + h * zd[j];
    truth_pend16_phi(to, none, plus);
    for (int j = 0; j < n; j++) to[j] = z[j] - h * zd[j];
    truth_pend16_phi(to, none, minus);
    for (int i = 0; i < N; i++) {
        qd[i] = qdd[i] = 0;
        for (int j = 0; j < n; j++) {
            const int e = n * i + j;
            qd[i] += J[e] * zd[j];
            qdd[i] += J[e] * zdd[j] + (plus[e] - minus[e]) / (2 * h) * zd[j];
        }
    }
}

/* ---- the model ---- */

struct control_model {
    pend16_params p;
    pend16_work work;
};

struct control_model *control_load(const char *path)
{
    static unsigned char bytes[pend16_packed_size + 1];
    struct control_model *m = malloc(sizeof *m);
    FILE *f = fopen(path, "rb");
    const int count = f ? (int)fread(bytes, 1, sizeof bytes, f) : 0;
    if (f) fclose(f);
    if (m && pend16_unpack(bytes, count, &m->p) == ROLN_OK) return m;
    fprintf(stderr, "%s: no model of examples/pend16.h\n", path);
    free(m);
    return NULL;
}

void control_free(struct control_model *m) { free(m); }

int control_gains(struct control_model *m, double w, double zeta, struct control_gains *g)
{
    enum { POSES = 1000 };
    uint64_t seed = 1;
    double mean[n] = {0};
    for (int k = 0; k < POSES; k++) {
        double x[n], q[N];
        roln_real M[n * n];
        pend16_state s;
        pend16_latent z;
        for (int j = 0; j < n; j++) x[j] = uniform(&seed, -.5, .5);
        truth_pend16_phi(x, q, NULL);
        for (int i = 0; i < N; i++) s.q[i] = (roln_real)q[i], s.qd[i] = 0;
        if (pend16_encode(&m->p, &s, &z, &m->work) != ROLN_OK ||
            pend16_terms(&m->p, &z, M, NULL, NULL, NULL, NULL, &m->work) != ROLN_OK) {
            fprintf(stderr, "control: no mass matrix\n");
            return -1;
        }
        for (int j = 0; j < n; j++) mean[j] += (double)M[j * (n + 1)] / POSES;
    }
    for (int j = 0; j < n; j++) {
        g->kp[j] = (roln_real)(w * w * mean[j]);
        g->kd[j] = (roln_real)(2 * zeta * w * mean[j]);
    }
    return 0;
}

/* ---- laws ---- */

typedef struct { roln_real q[N], qd[N], qdd[N]; } reference;
typedef roln_status law(const pend16_params *p, const pend16_state *x, const reference *ref, const roln_real *kp,
                        const roln_real *kd, roln_real *tau, pend16_work *work);

/* tau = D^T (-Kp e - Kd ed). */
static roln_status pd(const pend16_params *p, const pend16_state *x, const reference *ref, const roln_real *kp,
                      const roln_real *kd, roln_real *tau, pend16_work *work)
{
    pend16_state xr;
    pend16_latent s, r;
    roln_real tau_z[n];
    roln_status st = pend16_encode(p, x, &s, work);
    memcpy(xr.q, ref->q, sizeof xr.q);
    memcpy(xr.qd, ref->qd, sizeof xr.qd);
    if (st == ROLN_OK) st = pend16_encode(p, &xr, &r, work);
    if (st != ROLN_OK) return st;
    for (int j = 0; j < n; j++) tau_z[j] = -kp[j] * (s.z[j] - r.z[j]) - kd[j] * (s.zd[j] - r.zd[j]);
    return pend16_lift(p, &s, tau_z, tau, work);
}

/* tau = D^T (M zdd_ref + C zd_ref + g - Kp e - Kd ed). */
static roln_status latent(const pend16_params *p, const pend16_state *x, const reference *ref, const roln_real *kp,
                          const roln_real *kd, roln_real *tau, pend16_work *work)
{
    roln_real y[3 * N], r[3 * n], M[n * n], g[n], plus[n], minus[n], tau_z[n], tape[3 * pend16_ae_sum];
    pend16_latent s, a, b;
    roln_status st = pend16_encode(p, x, &s, work);
    if (st != ROLN_OK) return st;
    for (int i = 0; i < N; i++) {
        y[i] = ref->q[i] / p->scale.q;
        y[N + i] = ref->qd[i] / p->scale.q;
        y[2 * N + i] = ref->qdd[i] / p->scale.q;
    }
    roln_ae_encode(&pend16_model.ae, 3, 1, p->theta, y, r, tape);
    a = b = s;
    for (int j = 0; j < n; j++) { /* c is a quadratic form of zd: C(zd) w = (c(zd + w) - c(zd - w)) / 4 */
        a.zd[j] += r[n + j];
        b.zd[j] -= r[n + j];
    }
    st = pend16_terms(p, &a, M, plus, g, NULL, NULL, work);
    if (st == ROLN_OK) st = pend16_terms(p, &b, NULL, minus, NULL, NULL, NULL, work);
    if (st != ROLN_OK) return st;
    for (int j = 0; j < n; j++) {
        tau_z[j] = (plus[j] - minus[j]) / 4 + g[j] - kp[j] * (s.z[j] - r[j]) - kd[j] * (s.zd[j] - r[n + j]);
        for (int l = 0; l < n; l++) tau_z[j] += M[n * j + l] * r[2 * n + l];
    }
    return pend16_lift(p, &s, tau_z, tau, work);
}

/* A x = y for a symmetric positive-definite A, in place. */
static void solve(double A[n][n], double y[n])
{
    for (int i = 0; i < n; i++)
        for (int j = i + 1; j < n; j++) {
            const double f = A[j][i] / A[i][i];
            for (int l = i; l < n; l++) A[j][l] -= f * A[i][l];
            y[j] -= f * y[i];
        }
    for (int i = n - 1; i >= 0; i--) {
        for (int l = i + 1; l < n; l++) y[i] -= A[i][l] * y[l];
        y[i] /= A[i][i];
    }
}

/* Motors on joints 0, 4, 8, 12 alone, acting on z as tau does: tau becomes B u, u = G^T (G G^T + mu^2 I)^-1 J^T tau with
   G = J^T B. */
static roln_status four_motors(const pend16_params *p, const pend16_state *x, roln_real tau[N], pend16_work *work)
{
    const double mu = 1e-3;     /* of |G| */
    double G[n][n], A[n][n], y[n], size = 0;
    roln_real tau_z[n], column[n];
    pend16_latent s;
    roln_status st = pend16_encode(p, x, &s, work);
    if (st == ROLN_OK) st = pend16_reduce(p, &s, tau, tau_z, work);
    for (int k = 0; k < n && st == ROLN_OK; k++) {
        roln_real unit[N] = {0};
        unit[4 * k] = 1;
        st = pend16_reduce(p, &s, unit, column, work);
        for (int i = 0; i < n && st == ROLN_OK; i++) {
            G[i][k] = (double)column[i];
            size += G[i][k] * G[i][k];
        }
    }
    if (st != ROLN_OK) return st;
    for (int i = 0; i < n; i++) {
        y[i] = (double)tau_z[i];
        for (int j = 0; j < n; j++) {
            A[i][j] = i == j ? mu * mu * size : 0;
            for (int k = 0; k < n; k++) A[i][j] += G[i][k] * G[j][k];
        }
    }
    solve(A, y);
    memset(tau, 0, N * sizeof *tau);
    for (int k = 0; k < n; k++)
        for (int i = 0; i < n; i++) tau[4 * k] += (roln_real)(G[i][k] * y[i]);
    return ROLN_OK;
}

/* Nonzero if z of q lies in the range seen in training. */
static int in_range(struct control_model *m, const double q[N])
{
    pend16_state x;
    pend16_latent s;
    for (int i = 0; i < N; i++) x.q[i] = (roln_real)q[i], x.qd[i] = 0;
    return pend16_encode(&m->p, &x, &s, &m->work) == ROLN_OK && pend16_in_range(&m->p, &s);
}

/* ---- the loop ---- */

int control_run(struct control_model *m, const struct control_reference *r, enum control_law which,
                const struct control_gains *gains, int steps, struct control_result *result, double *trace)
{
    law *const control = which == CONTROL_LATENT || which == CONTROL_LATENT_4 ? latent : pd;
    struct truth_plant *plant;
    struct control_result sum = {0, 0, 0, 0, 0, 0, 0, 0};
    double q[N], qd[N], qr[N], qdr[N], qddr[N], tau[N] = {0}, g[N] = {0};
    int status = 0, early = 0, late = 0;
    control_reference_at(r, 0, qr, qdr, qddr);
    if (truth_plant_open(&plant, qr, qdr)) return -1;
    for (int k = 0; k < steps && status == 0; k++) {
        double e2 = 0;
        pend16_state x;
        reference ref;
        roln_real f[N];
        roln_status st;
        truth_plant_state(plant, q, qd);
        control_reference_at(r, k * DT, qr, qdr, qddr);
        for (int i = 0; i < N; i++) {
            const double e = q[i] - qr[i];
            e2 += e * e;
            if (i % 4 == 0) sum.rms_free += e * e;
            sum.max = fabs(e) <= sum.max ? sum.max : fabs(e);       /* keeps NaN */
            x.q[i] = (roln_real)q[i], x.qd[i] = (roln_real)qd[i];
            ref.q[i] = (roln_real)qr[i], ref.qd[i] = (roln_real)qdr[i], ref.qdd[i] = (roln_real)qddr[i];
        }
        sum.rms += e2;
        if (k >= 2000 && k < 12000) sum.early += e2, early++;
        if (k >= steps - 10000) sum.late += e2, late++;
        sum.outside += !in_range(m, q) || !in_range(m, qr);
        if (trace) memcpy(trace + (size_t)k * N, q, sizeof q);

        st = control(&m->p, &x, &ref, gains->kp, gains->kd, f, &m->work);
        if (st == ROLN_OK && (which == CONTROL_PD_4 || which == CONTROL_LATENT_4)) st = four_motors(&m->p, &x, f, &m->work);
        if (which == CONTROL_PD_GRAVITY) truth_plant_gravity(plant, g);
        if (st != ROLN_OK) sum.bad++;                               /* tau stays */
        for (int i = 0; i < N; i++) {
            if (st == ROLN_OK) tau[i] = (double)f[i] + g[i];
            sum.tau += tau[i] * tau[i];
        }
        status = truth_plant_step(plant, tau);
    }
    truth_plant_close(plant);
    sum.rms = sqrt(sum.rms / (steps * N));
    sum.rms_free = sqrt(sum.rms_free / (steps * n));
    sum.early = sqrt(sum.early / (early * N));
    sum.late = sqrt(sum.late / (late * N));
    sum.tau = sqrt(sum.tau / steps);
    sum.outside /= steps;
    *result = sum;
    return status;
}

void control_heading(void)
{
    printf("                        error, mrad: rms of 16   of 4 free    largest   first, last 10 s   |tau|, N m   outside   to PD\n");
}

void control_row(enum control_law which, const struct control_result *r, const struct control_result *pd_result)
{
    printf("  %-18s            %10.2f  %10.2f %10.2f %9.2f %8.2f %12.3f %8.1f %%   1/%.1f\n", control_name(which), 1e3 * r->rms,
           1e3 * r->rms_free, 1e3 * r->max, 1e3 * r->early, 1e3 * r->late, r->tau, 100 * r->outside, pd_result->rms / r->rms);
}
