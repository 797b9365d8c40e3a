/* SPDX-License-Identifier: MIT */
#include "control.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/pend16.h"
#include "../mujoco/truth.h"

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
    truth_phi(TRUTH_PEND16, z, q, J);
    for (int j = 0; j < n; j++) to[j] = z[j] + h * zd[j];
    truth_phi(TRUTH_PEND16, to, none, plus);
    for (int j = 0; j < n; j++) to[j] = z[j] - h * zd[j];
    truth_phi(TRUTH_PEND16, to, none, minus);
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
    enum control_law law; /* of the controller, and its state */
    pend16_target ref;
    pend16_state x;
    pend16_latent s;
    pend16_guard guard;
};

struct control_model *control_load(const char *path)
{
    static unsigned char bytes[pend16_packed_size + 1];
    struct control_model *m = malloc(sizeof *m);
    FILE *f = fopen(path, "rb");
    const int count = f ? (int)fread(bytes, 1, sizeof bytes, f) : 0;
    if (f) fclose(f);
    if (m && pend16_unpack(count, bytes, &m->p) == ROLN_OK) return m;
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
        pend16_equation e;
        pend16_state s;
        pend16_latent z;
        for (int j = 0; j < n; j++) x[j] = uniform(&seed, -.5, .5);
        truth_phi(TRUTH_PEND16, x, q, NULL);
        for (int i = 0; i < N; i++) s.q[i] = (roln_real)q[i], s.qd[i] = 0;
        if (pend16_encode(&m->p, &s, &z, &m->work.encode) != ROLN_OK ||
            pend16_dynamics(&m->p, &z, &e, &m->work.dynamics) != ROLN_OK) {
            fprintf(stderr, "control: no mass matrix\n");
            return -1;
        }
        for (int j = 0; j < n; j++) mean[j] += (double)e.M[j * (n + 1)] / POSES;
    }
    for (int j = 0; j < n; j++) {
        g->kp[j] = (roln_real)(w * w * mean[j]);
        g->kd[j] = (roln_real)(2 * zeta * w * mean[j]);
    }
    return 0;
}

/* ---- laws ---- */

/* tau_z of a law: PD alone, or with M zdd_ref + C zd_ref + g. */
static roln_status law(struct control_model *m, int pd, const pend16_latent *s, const pend16_target *r, roln_real tau_z[n])
{
    if (!pd) return pend16_control(&m->p, s, r, tau_z, &m->work.control);
    for (int j = 0; j < n; j++) tau_z[j] = -r->kp[j] * (s->z[j] - r->z[j]) - r->kd[j] * (s->zd[j] - r->zd[j]);
    return ROLN_OK;
}

/* tau_z to the joints: lifted to all of them, or by the motors of joints 0, 4, 8, 12 alone. */
static roln_status drive(struct control_model *m, int motors, const pend16_latent *s, const roln_real tau_z[n],
                         roln_real tau[N])
{
    static const roln_real B[N * 4] = {[0] = 1, [4 * 4 + 1] = 1, [8 * 4 + 2] = 1, [12 * 4 + 3] = 1};
    static const roln_motors four = {4, B, ROLN_C(1e-3)};
    roln_real u[4];
    roln_status st;
    if (!motors) return pend16_lift(&m->p, s, tau_z, tau, &m->work.lift);
    st = pend16_allocate(&m->p, s, &four, tau_z, u, NULL, &m->work.allocate);
    memset(tau, 0, N * sizeof *tau);
    for (int k = 0; k < 4 && st == ROLN_OK; k++) tau[4 * k] = u[k];
    return st;
}

void control_start(struct control_model *m, enum control_law which, const struct control_gains *gains)
{
    m->law = which;
    memset(&m->ref, 0, sizeof m->ref);
    memcpy(m->ref.kp, gains->kp, sizeof m->ref.kp);
    memcpy(m->ref.kd, gains->kd, sizeof m->ref.kd);
    memset(&m->x, 0, sizeof m->x);
    memset(&m->s, 0, sizeof m->s);
    memset(&m->guard, 0, sizeof m->guard);
}

int control_encode_reference(struct control_model *m, const roln_real *x, roln_real z_ref[3 * n])
{
    pend16_target r;
    if (pend16_encode_reference(&m->p, x + 2 * N, x + 3 * N, x + 4 * N, &r, &m->work.encode_reference) != ROLN_OK) return -1;
    memcpy(z_ref, r.z, sizeof r.z);
    memcpy(z_ref + n, r.zd, sizeof r.zd);
    memcpy(z_ref + 2 * n, r.zdd, sizeof r.zdd);
    return 0;
}

int control_tick(void *model, const roln_real *x, roln_real *tau)
{
    static const roln_limits limits = {
        .dt = (roln_real)DT, .margin = ROLN_C(0.05), .residual = (roln_real)CONTROL_POWER, .tau = (roln_real)CONTROL_TORQUE,
        .hold = CONTROL_HOLD, .q_tolerance = (roln_real)CONTROL_OFF, .qd_tolerance = (roln_real)CONTROL_OFF_RATE};
    struct control_model *m = model;
    const int latent = m->law == CONTROL_LATENT || m->law == CONTROL_LATENT_4;
    roln_real f[N], tau_z[n];
    roln_status seen = ROLN_OK, st = ROLN_E_LENGTH; /* no measurement: the state is the last one */
    uint32_t faults;
    if (x) {
        memcpy(m->x.q, x, sizeof m->x.q);
        memcpy(m->x.qd, x + N, sizeof m->x.qd);
        st = seen = pend16_encode(&m->p, &m->x, &m->s, &m->work.encode);
        if (st == ROLN_OK) st = pend16_encode_reference(&m->p, x + 2 * N, x + 3 * N, x + 4 * N, &m->ref, &m->work.encode_reference);
        if (st == ROLN_OK) st = law(m, !latent, &m->s, &m->ref, tau_z);
        if (st == ROLN_OK) st = drive(m, m->law == CONTROL_PD_4 || m->law == CONTROL_LATENT_4, &m->s, tau_z, f);
    }
    if (latent) { /* the guard lets everything pass */
        const pend16_latent *s = seen == ROLN_OK ? &m->s : NULL;
        faults = pend16_guard_tick(&m->p, &limits, &m->x, s, st == ROLN_OK ? f : NULL, &m->guard, &m->work.guard_tick);
        memcpy(tau, m->guard.tau, sizeof f);
    } else {
        faults = st == ROLN_OK ? 0 : ROLN_FAULT_STATUS;
        if (st == ROLN_OK) memcpy(tau, f, sizeof f);
    }
    return (int)faults;
}

/* ---- the loop ---- */

/* Nonzero if z of q lies in the range seen in training. */
static int in_range(struct control_model *m, const double q[N])
{
    pend16_state x;
    pend16_latent s;
    for (int i = 0; i < N; i++) x.q[i] = (roln_real)q[i], x.qd[i] = 0;
    return pend16_encode(&m->p, &x, &s, &m->work.encode) == ROLN_OK && pend16_in_range(&m->p, &s);
}

int control_loop(struct control_model *m, const struct control_reference *r, control_controller *tick, void *ctx, int gravity,
                 int steps, struct control_result *result, double *trace)
{
    struct truth_plant *plant;
    struct control_result sum = {0, 0, 0, 0, 0, 0, 0, 0, 0};
    double q[N], qd[N], qr[N], qdr[N], qddr[N], tau[N], g[N] = {0};
    roln_real x[5][N], f[N] = {0};
    int status = 0, early = 0, late = 0;
    control_reference_at(r, 0, qr, qdr, qddr);
    if (truth_plant_open(&plant, qr, qdr)) return -1;
    for (int k = 0; k < steps && status == 0; k++) {
        double e2 = 0;
        truth_plant_state(plant, q, qd);
        control_reference_at(r, k * DT, qr, qdr, qddr);
        for (int i = 0; i < N; i++) {
            const double e = q[i] - qr[i];
            e2 += e * e;
            if (i % 4 == 0) sum.rms_free += e * e;
            sum.max = fabs(e) <= sum.max ? sum.max : fabs(e);       /* keeps NaN */
            x[0][i] = (roln_real)q[i], x[1][i] = (roln_real)qd[i];
            x[2][i] = (roln_real)qr[i], x[3][i] = (roln_real)qdr[i], x[4][i] = (roln_real)qddr[i];
        }
        sum.rms += e2;
        if (k >= 2000 && k < (steps + 2000) / 2) sum.early += e2, early++;
        if (k >= (steps + 2000) / 2) sum.late += e2, late++;
        sum.outside += !in_range(m, q) || !in_range(m, qr);
        if (trace) memcpy(trace + (size_t)k * N, q, sizeof q);

        const int faults = tick(ctx, x[0], f);
        if (faults < 0) status = -1;
        sum.faults += faults != 0;
        sum.bad += ((uint32_t)faults & ROLN_FAULT_STATUS) != 0;
        if (gravity) truth_plant_gravity(plant, g);
        for (int i = 0; i < N; i++) {
            tau[i] = (double)f[i] + g[i];
            sum.tau += tau[i] * tau[i];
        }
        if (status == 0) status = truth_plant_step(plant, tau);
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

int control_run(struct control_model *m, const struct control_reference *r, enum control_law which,
                const struct control_gains *gains, int steps, struct control_result *result, double *trace)
{
    control_start(m, which, gains);
    return control_loop(m, r, control_tick, m, which == CONTROL_PD_GRAVITY, steps, result, trace);
}

void control_heading(void)
{
    printf("                        error, mrad: rms of 16   of 4 free    largest     of each half    |tau|, N m   outside"
           "   to PD\n");
}

void control_row(enum control_law which, const struct control_result *r, const struct control_result *pd_result)
{
    printf("  %-18s            %10.2f  %10.2f %10.2f %9.2f %8.2f %12.3f %8.1f %%   1/%.1f\n", control_name(which), 1e3 * r->rms,
           1e3 * r->rms_free, 1e3 * r->max, 1e3 * r->early, 1e3 * r->late, r->tau, 100 * r->outside, pd_result->rms / r->rms);
}
