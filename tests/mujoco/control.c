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

/* tau_z = -Kp e - Kd ed; with `model` nonzero + M zdd_ref + C zd_ref + g. */
static roln_status latent_force(struct control_model *m, int model, const pend16_latent *s, const reference *ref,
                                const struct control_gains *k, roln_real tau_z[n])
{
    const roln_ae *ae = &pend16_model.ae;
    roln_real x[3 * N], r[3 * n], M[n * n], g[n], plus[n], minus[n], tape[3 * pend16_ae_sum];
    pend16_latent a = *s, b = *s;
    roln_status st;
    for (int i = 0; i < N; i++) {
        x[i] = ref->q[i] / m->p.scale.q;
        x[N + i] = ref->qd[i] / m->p.scale.q;
        x[2 * N + i] = ref->qdd[i] / m->p.scale.q;
    }
    roln_ae_encode(ae, 3, 1, m->p.theta, x, r, tape);
    for (int j = 0; j < n; j++)
        tau_z[j] = -k->kp[j] * (s->z[j] - r[j]) - k->kd[j] * (s->zd[j] - r[n + j]);
    if (!model) return ROLN_OK;
    for (int j = 0; j < n; j++) { /* c is a quadratic form of zd: C(zd) w = (c(zd + w) - c(zd - w)) / 4 */
        a.zd[j] += r[n + j];
        b.zd[j] -= r[n + j];
    }
    st = pend16_terms(&m->p, &a, M, plus, g, NULL, NULL, &m->work);
    if (st == ROLN_OK) st = pend16_terms(&m->p, &b, NULL, minus, NULL, NULL, NULL, &m->work);
    if (st != ROLN_OK) return st;
    for (int j = 0; j < n; j++) {
        tau_z[j] += g[j] + (plus[j] - minus[j]) / 4;
        for (int l = 0; l < n; l++) tau_z[j] += M[n * j + l] * r[2 * n + l];
    }
    return ROLN_OK;
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

/* tau = B u with u = G^T (G G^T + mu^2 I)^-1 tau_z, G = J^T B: the motors of joints 0, 4, 8, 12 act on z as tau_z. */
static roln_status four_motors(struct control_model *m, const pend16_latent *s, const roln_real tau_z[n], roln_real tau[N])
{
    const double mu = 1e-3;     /* of the size of G */
    double G[n][n], A[n][n], y[n], size = 0;
    for (int k = 0; k < n; k++) {
        roln_real unit[N] = {0}, column[n];
        unit[4 * k] = 1;
        const roln_status st = pend16_reduce(&m->p, s, unit, column, &m->work);
        if (st != ROLN_OK) return st;
        for (int i = 0; i < n; i++) {
            G[i][k] = (double)column[i];
            size += G[i][k] * G[i][k];
        }
    }
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

/* One tick of a law: tau from the measured state and the reference. */
static roln_status tick(struct control_model *m, enum control_law law, const pend16_state *x, const reference *ref,
                        const struct control_gains *k, pend16_latent *s, roln_real tau[N])
{
    const int model = law == CONTROL_LATENT || law == CONTROL_LATENT_4;
    roln_real tau_z[n];
    roln_status st = pend16_encode(&m->p, x, s, &m->work);
    if (st == ROLN_OK) st = latent_force(m, model, s, ref, k, tau_z);
    if (st != ROLN_OK) return st;
    if (law == CONTROL_PD_4 || law == CONTROL_LATENT_4) return four_motors(m, s, tau_z, tau);
    return pend16_lift(&m->p, s, tau_z, tau, &m->work);
}

/* ---- the loop ---- */

int control_run(struct control_model *m, const struct control_reference *r, enum control_law law,
                const struct control_gains *gains, int steps, struct control_result *result, double *trace)
{
    struct truth_plant *plant;
    struct control_result sum = {0, 0, 0, 0, 0, 0, 0, 0};
    double q[N], qd[N], qr[N], qdr[N], qddr[N], tau[N] = {0}, g[N];
    int status = 0, early = 0, late = 0;
    control_reference_at(r, 0, qr, qdr, qddr);
    if (truth_plant_open(&plant, qr, qdr)) return -1;
    for (int k = 0; k < steps && status == 0; k++) {
        double e2 = 0;
        pend16_state x, xr;
        pend16_latent s, sr;
        reference ref;
        roln_real f[N];
        truth_plant_state(plant, q, qd);
        control_reference_at(r, k * DT, qr, qdr, qddr);
        for (int i = 0; i < N; i++) {
            const double e = q[i] - qr[i];
            e2 += e * e;
            if (i % 4 == 0) sum.rms_free += e * e;
            sum.max = fabs(e) <= sum.max ? sum.max : fabs(e);       /* keeps NaN */
            x.q[i] = (roln_real)q[i], x.qd[i] = (roln_real)qd[i];
            xr.q[i] = ref.q[i] = (roln_real)qr[i], xr.qd[i] = ref.qd[i] = (roln_real)qdr[i];
            ref.qdd[i] = (roln_real)qddr[i];
        }
        sum.rms += e2;
        if (k >= 2000 && k < 12000) sum.early += e2, early++;
        if (k >= steps - 10000) sum.late += e2, late++;
        if (trace) memcpy(trace + (size_t)k * N, q, sizeof q);

        if (tick(m, law, &x, &ref, gains, &s, f) != ROLN_OK) sum.bad++;     /* tau stays */
        else {
            sum.outside += !(pend16_in_range(&m->p, &s) && pend16_encode(&m->p, &xr, &sr, &m->work) == ROLN_OK &&
                             pend16_in_range(&m->p, &sr));
            truth_plant_gravity(plant, g);
            for (int i = 0; i < N; i++) tau[i] = (double)f[i] + (law == CONTROL_PD_GRAVITY ? g[i] : 0);
        }
        for (int i = 0; i < N; i++) sum.tau += tau[i] * tau[i];
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
