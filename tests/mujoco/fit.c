/* fit - trains the mass matrix and the potential of a pend16 on forces; its autoencoder stays as it is.
     fit IN.roln OUT.roln [updates]
   The residual r = M zdd + c + g - tau_z of recorded motion, without the inverse of M: a slow, heavy direction counts as
   much as a fast, light one. Half the recordings are driven by a PD controller (TRUTH_PEND16_PD): along the free motion
   each mode may be scaled as it likes, M with V, and only forces that matter tell its inertia. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "../../examples/pend16.h"
#include "truth.h"

enum { N = pend16_N, n = pend16_n, BATCH = 64, EVERY = 3, TRAJECTORIES = 150, UPDATES = 200000 };
#define RATE 3e-3        /* first learning rate; falls along a cosine to a thousandth */
#define ACCELERATION 1.0 /* weight of |M^-1 r|^2, M^-1 held fixed, beside |D^-1 r|^2, D the mean diagonal of M */
#define TAME 1.0         /* recordings in which a free joint goes beyond are left out, rad */
#define CLIP 20.0        /* of the gradient norm */

typedef struct { roln_real z[n], zd[n], zdd[n], tau_z[n]; } sample;     /* time in units of scale.t */

static pend16_params p;
static pend16_work work;
static sample *set;
static int samples;

static int add(enum truth_system system)
{
    struct truth_set s;
    if (truth_generate(&s, system, TRUTH_TRAIN, 1, 0, TRAJECTORIES, TRUTH_SAMPLES)) return -1;
    const roln_real t = p.scale.t;
    for (size_t k = 0; k < TRAJECTORIES; k++) {
        double far = 0;
        for (size_t i = 0; i < TRUTH_SAMPLES * n; i++) far = fmax(far, fabs(s.z[k * TRUTH_SAMPLES * n + i]));
        for (size_t i = 0; i < TRUTH_SAMPLES && far <= TAME; i += EVERY) {
            const size_t row = (k * TRUTH_SAMPLES + i) * N;
            roln_real x[3 * N], z[3 * n], tau[N], tape[3 * pend16_ae_sum];
            pend16_latent l;
            sample *d = &set[samples++];
            for (size_t j = 0; j < N; j++) {
                x[j] = (roln_real)s.q[row + j] / p.scale.q;
                x[N + j] = (roln_real)s.qd[row + j] / p.scale.q;
                x[2 * N + j] = (roln_real)s.qdd[row + j] / p.scale.q;
                tau[j] = (roln_real)s.tau_model[row + j];
            }
            roln_ae_encode(&pend16_model.ae, 3, 1, p.theta, x, z, tape);
            memcpy(l.z, z, sizeof l.z);
            memcpy(l.zd, z + n, sizeof l.zd);
            if (pend16_reduce(&p, &l, tau, d->tau_z, &work) != ROLN_OK) return -1;
            for (int j = 0; j < n; j++) {
                d->z[j] = z[j];
                d->zd[j] = z[n + j] * t;
                d->zdd[j] = z[2 * n + j] * t * t;
                d->tau_z[j] *= t * t;
                p.z_min[j] = z[j] < p.z_min[j] ? z[j] : p.z_min[j];
                p.z_max[j] = z[j] > p.z_max[j] ? z[j] : p.z_max[j];
            }
        }
    }
    truth_free(&s);
    return 0;
}

/* Adam, elementwise. */
static void update(int count, roln_real *theta, const roln_real *g, double lr, int t)
{
    static double m[pend16_theta_size], v[pend16_theta_size];
    const double b1 = 1 - pow(.9, t), b2 = 1 - pow(.999, t);
    double norm = 0;
    for (int i = 0; i < count; i++) norm += (double)g[i] * (double)g[i];
    const double clip = fmin(1, CLIP / sqrt(norm));
    for (int i = 0; i < count; i++) {
        const double gi = clip * (double)g[i];
        m[i] = .9 * m[i] + .1 * gi;
        v[i] = .999 * v[i] + .001 * gi * gi;
        theta[i] -= (roln_real)(lr * (m[i] / b1) / (sqrt(v[i] / b2) + 1e-8));
    }
}

static int train(int updates)
{
    static roln_real tape[ROLN_LNN_TAPE(n, pend16_hidden, 2, BATCH)], w[ROLN_LNN_WORK(n, pend16_wide, 2, BATCH)];
    static roln_real g[pend16_theta_size];
    const roln_lnn *lnn = &pend16_model.lnn;
    const int count = roln_lnn_params(lnn);
    const rolni_tape t = rolni_tape_of(lnn, 2, BATCH, tape);
    roln_real *theta = p.theta + roln_ae_params(&pend16_model.ae);
    double D[n] = {0}, force = 0, acceleration = 0, size = 0;
    uint64_t seed = 5;
    for (int k = 0; k < 1000; k++) {
        roln_real M[n * n];
        pend16_latent l;
        memcpy(l.z, set[k * (samples / 1000)].z, sizeof l.z);
        memset(l.zd, 0, sizeof l.zd);
        if (pend16_terms(&p, &l, M, NULL, NULL, NULL, NULL, &work) != ROLN_OK) return -1;
        for (int i = 0; i < n; i++) D[i] += 1e-3 * (double)M[i * (n + 1)];
    }
    for (int u = 1; u <= updates; u++) {
        const double at = (double)u / updates, lr = RATE * fmin(1, 100 * at) * (1e-3 + .4995 * (1 + cos(3.14159265358979 * at)));
        roln_real s[2 * BATCH * n], zdd[BATCH * n], tau_z[BATCH * n], y[BATCH * n];
        for (int r = 0; r < BATCH; r++) {
            const sample *d = &set[roln_randint(samples, &seed)];
            memcpy(s + r * n, d->z, sizeof d->z);
            memcpy(s + (BATCH + r) * n, d->zd, sizeof d->zd);
            memcpy(zdd + r * n, d->zdd, sizeof d->zdd);
            memcpy(tau_z + r * n, d->tau_z, sizeof d->tau_z);
        }
        if (rolni_eval(lnn, 2, BATCH, theta, s, 1, tape, w) != ROLN_OK) return -1;
        for (int r = 0; r < BATCH; r++) {
            const roln_real *Q = t.Q + r * n * n, *el = t.el + r * n;
            roln_real res[n], a[n], aa[n];
            for (int i = 0; i < n; i++) {
                res[i] = t.dmv[r * n + i] - t.kin[r * n + i] + t.g[r * n + i] - tau_z[r * n + i];
                for (int j = 0; j < n; j++)
                    for (int k = 0; k < n; k++) res[i] += Q[k * n + i] * Q[k * n + j] / el[k] * zdd[r * n + j];
            }
            rolni_minv(n, Q, el, res, a, w);
            rolni_minv(n, Q, el, a, aa, w);
            for (int i = 0; i < n; i++) { /* - the cotangent of r */
                y[r * n + i] = (roln_real)(-((double)res[i] / (D[i] * D[i]) + ACCELERATION * (double)aa[i]) / BATCH);
                force += (double)res[i] * (double)res[i] / (D[i] * D[i]);
                acceleration += (double)a[i] * (double)a[i];
                size += (double)zdd[r * n + i] * (double)zdd[r * n + i];
            }
        }
        memset(g, 0, sizeof g);
        rolni_adjoint(lnn, BATCH, theta, tape, 1, y, y, zdd, NULL, NULL, g, w);
        update(count, theta, g, lr, u);
        if (u % (updates / 10) == 0) {
            printf("%7d  |D^-1 r| %.2f %%  |M^-1 r| %.2f %% of |zdd|\n", u, 100 * sqrt(force / size), 100 * sqrt(acceleration / size));
            fflush(stdout);
            force = acceleration = size = 0;
        }
    }
    return 0;
}

int main(int argc, char **argv)
{
    static unsigned char bytes[pend16_packed_size];
    FILE *f = argc > 2 ? fopen(argv[1], "rb") : NULL;
    if (!f || pend16_unpack(bytes, (int)fread(bytes, 1, sizeof bytes, f), &p) != ROLN_OK) {
        fprintf(stderr, "fit IN.roln OUT.roln [updates]\n");
        return 2;
    }
    fclose(f);
    set = malloc(2 * TRAJECTORIES * (TRUTH_SAMPLES / EVERY) * sizeof *set);
    for (int i = 0; i < n; i++) p.z_min[i] = ROLN_C(1e9), p.z_max[i] = -ROLN_C(1e9);
    if (!set || add(TRUTH_PEND16_PD) || add(TRUTH_PEND16_ACT)) return 1;
    printf("%d samples\n", samples);
    if (train(argc > 3 ? atoi(argv[3]) : UPDATES)) return 1;
    pend16_pack(&p, bytes);
    f = fopen(argv[2], "wb");
    if (!f || fwrite(bytes, 1, sizeof bytes, f) != sizeof bytes || fclose(f)) {
        perror(argv[2]);
        return 1;
    }
    free(set);
    return 0;
}
