/* SPDX-License-Identifier: MIT */
/* The committed models against freshly simulated trajectories that they have not seen. Errors as defined in README:
   E_q(h) = sqrt(mean_w |q_pred - q|^2 / mean_w |q - qbar|^2) over every window start at a multiple of 25 ms, `whole`: one
   window per trajectory, mean over all its samples. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "examples/pend16.h"
#include "examples/pend16_int8.h"
#define ROLN_NAME pend16_half
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR rk4
#define ROLN_QUANTISE half
#include "roln.h"
#include "examples/pend2.h"
#include "../unit/check.h"
#include "truth.h"

void test_models(void);

#define SEED 1
#define TEST_COUNT 10
#define PEND16_EQ25 0.05
#define PEND16_EQD25 0.4
#define PEND16_EQ1000 4.0 /* reached; aimed at 2 */
#define FOLDER "tests/mujoco/models/"

/* Truth as the library wants it. */
typedef struct {
    int count, samples, dof;
    roln_real *q, *qd, *tau, *qbar;
    double pod; /* E_q that the rank-n POD of the training q leaves, % */
} motion;

/* A one-layer autoencoder of slope 1 is the POD; of the trajectories that the models are trained on (mild.awk). */
static double pod_error(const struct truth_set *train, const motion *d, int n)
{
    const int N = d->dof, length = train->samples * N, tests = d->count * d->samples;
    const roln_ae ae = {1, {N, n}, 1, ROLN_FULL, ROLN_UNBENT, 0, 0, 0};
    roln_real *q = malloc((size_t)(train->count * length) * sizeof *q);
    roln_real *theta = malloc((size_t)roln_ae_params(&ae) * sizeof *theta);
    const int N1 = n, ae_sum = n, monomials = 0, keeps = 0; /* sizes for the macros */
    const int pod = ROLN_AE_POD_WORK(ROLNI_LOCAL), encode = ROLN_AE_ENCODE_TAPE(ROLNI_LOCAL, 1, 1);
    const int room = ROLN_MAX(pod, ROLN_MAX(encode, ROLN_AE_DECODE_TAPE(ROLNI_LOCAL, 1, 1)));
    roln_real *work = malloc((size_t)room * sizeof *work);
    double *sums = malloc((size_t)ROLN_AE_POD_ROOM(ROLNI_LOCAL) * sizeof *sums), e = 0, v = 0;
    int rows = 0;
    for (int t = 0; t < train->count; t++) {
        int wild = 0;
        for (int i = 0; i < length; i++) {
            q[rows * N + i] = (roln_real)train->q[t * length + i];
            wild |= i % N == 12 && fabs(train->q[t * length + i]) >= 2.1;
        }
        rows += wild ? 0 : train->samples;
    }
    CHECK(roln_ae_init_pod(&ae, rows, q, 1, NULL, theta, sums, work) == ROLN_OK);
    for (int k = 0; k < tests; k += 25) {
        roln_real z[16], x[16];
        roln_ae_encode(&ae, 1, 1, theta, d->q + k * N, z, work);
        roln_ae_decode(&ae, 1, 1, theta, z, x, work);
        for (int i = 0; i < N; i++) {
            const double r = (double)(x[i] - d->q[k * N + i]), c = (double)(d->q[k * N + i] - d->qbar[i]);
            e += r * r, v += c * c;
        }
    }
    free(q), free(theta), free(work), free(sums);
    return 100 * sqrt(e / v);
}

static motion simulate(enum truth_system system, int training)
{
    struct truth_set train, test;
    motion d = {0, 0, 0, NULL, NULL, NULL, NULL, 0};
    if (!CHECK(truth_generate(&train, system, TRUTH_TRAIN, SEED, 0, training, truth_samples(system)) == 0)) return d;
    if (!CHECK(truth_generate(&test, system, TRUTH_TEST, SEED, 0, TEST_COUNT, truth_samples(system)) == 0)) return d;
    const size_t total = (size_t)test.count * (size_t)test.samples * (size_t)test.dof, N = (size_t)test.dof;
    const size_t train_total = (size_t)train.count * (size_t)train.samples * N;
    d.count = test.count, d.samples = test.samples, d.dof = test.dof;
    d.q = malloc(total * sizeof *d.q), d.qd = malloc(total * sizeof *d.q), d.tau = malloc(total * sizeof *d.q);
    d.qbar = calloc(N, sizeof *d.qbar);
    for (size_t i = 0; i < total; i++)
        d.q[i] = (roln_real)test.q[i], d.qd[i] = (roln_real)test.qd[i], d.tau[i] = (roln_real)test.tau_model[i];
    for (size_t j = 0; j < N; j++) {
        double sum = 0;
        for (size_t i = j; i < train_total; i += N)
            sum += train.q[i];
        d.qbar[j] = (roln_real)(sum / (double)(train_total / N));
    }
    if (N == 16) d.pod = pod_error(&train, &d, 4);
    truth_free(&train);
    truth_free(&test);
    return d;
}

static void release(motion *d)
{
    free(d->q), free(d->qd), free(d->tau), free(d->qbar);
}

static int load(const char *file, unsigned char *bytes, int size)
{
    FILE *f = fopen(file, "rb");
    int count = 0;
    if (f) count = (int)fread(bytes, 1, (size_t)size, f), fclose(f);
    return count;
}

/* Any model, its sizes and the functions that are called here. s: z, zd [2n]; energy: T, V; p: its parameters. */
typedef struct {
    const void *p;
    const roln_model *md;
    roln_status (*encode)(const void *p, const roln_real *q, const roln_real *qd, roln_real *s);
    roln_status (*decode)(const void *p, const roln_real *s, roln_real *q, roln_real *qd);
    roln_status (*step)(const void *p, roln_real *s, const roln_real *tau);
    roln_status (*reduce)(const void *p, const roln_real *s, const roln_real *tau, roln_real *tau_z);
    roln_status (*energy)(const void *p, const roln_real *s, double E[2]);
    roln_status (*errors)(const void *p, const roln_batch *b, int every, const roln_real *qbar, const roln_errors *e);
} any;

#define DT ROLN_C(1e-3)
#define ANY(NAME) \
    static union { NAME##_work work; NAME##_train train; } NAME##_room; \
    static roln_status NAME##_encode_any(const void *p, const roln_real *q, const roln_real *qd, roln_real *s) \
    { \
        NAME##_state x; \
        memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd); \
        return NAME##_encode(p, &x, (NAME##_latent *)(void *)s, &NAME##_room.work.encode); \
    } \
    static roln_status NAME##_decode_any(const void *p, const roln_real *s, roln_real *q, roln_real *qd) \
    { \
        NAME##_state x; \
        const roln_status st = NAME##_decode(p, (const NAME##_latent *)(const void *)s, &x, &NAME##_room.work.decode); \
        if (st == ROLN_OK) memcpy(q, x.q, sizeof x.q), memcpy(qd, x.qd, sizeof x.qd); \
        return st; \
    } \
    static roln_status NAME##_step_any(const void *p, roln_real *s, const roln_real *tau) \
    { \
        return NAME##_step(p, (NAME##_latent *)(void *)s, tau, DT, &NAME##_room.work.step); \
    } \
    static roln_status NAME##_reduce_any(const void *p, const roln_real *s, const roln_real *tau, roln_real *tau_z) \
    { \
        return NAME##_reduce(p, (const NAME##_latent *)(const void *)s, tau, tau_z, &NAME##_room.work.reduce); \
    } \
    static roln_status NAME##_energy_any(const void *p, const roln_real *s, double E[2]) \
    { \
        NAME##_equation e = {.T = 0}; \
        const roln_status st = NAME##_dynamics(p, (const NAME##_latent *)(const void *)s, &e, &NAME##_room.work.dynamics); \
        E[0] = (double)e.T, E[1] = (double)e.V; \
        return st; \
    } \
    static roln_status NAME##_errors_any(const void *p, const roln_batch *b, int every, const roln_real *qbar, \
                                         const roln_errors *e) \
    { \
        return NAME##_errors(p, b, DT, every, qbar, e, &NAME##_room.train.errors); \
    } \
    static any NAME##_any(const NAME##_params *p) \
    { \
        return (any){p, &NAME##_model, NAME##_encode_any, NAME##_decode_any, NAME##_step_any, NAME##_reduce_any, \
                     NAME##_energy_any, NAME##_errors_any}; \
    }
ANY(pend16)
ANY(pend16_half)
ANY(pend16_int8)
ANY(pend2)

/* E_q, E_qd, and the error of q that half of the windows and nine in ten stay below, in percent. */
typedef struct {
    double q, qd, median, most;
} figures;

static int smaller(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Errors at horizon h samples over all windows; h = -1: whole trajectories. */
static roln_status errors(const any *a, const motion *d, int forces, int h, figures *e)
{
    const int steps = h < 0 ? d->samples - 1 : h;
    int *start = malloc((size_t)(d->count * d->samples) * sizeof *start), count = 0;
    roln_error *at = calloc((size_t)(steps + 1), sizeof *at), *windows;
    double *each, q = 0, q_var = 0, qd = 0, qd_var = 0;
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i + steps < d->samples; i += h < 0 ? d->samples : 25)
            start[count++] = k * d->samples + i;
    const roln_batch b = {
        .count = count, .steps = steps, .stride = 1, .start = start, .q = d->q, .qd = d->qd, .tau = forces ? d->tau : NULL};
    windows = calloc((size_t)((steps + 1) * count), sizeof *windows), each = calloc((size_t)count, sizeof *each);
    const roln_status st = a->errors(a->p, &b, h < 0 ? 1 : h > 0 ? h : 1, d->qbar, &(roln_errors){at, NULL, windows});
    for (int k = h > 0 ? 1 : 0; k <= (h < 0 ? steps : h > 0); k++) {
        q += at[k].q, q_var += at[k].q_var, qd += at[k].qd, qd_var += at[k].qd_var;
        for (int w = 0; w < count; w++)
            each[w] += windows[k * count + w].q;
    }
    qsort(each, (size_t)count, sizeof *each, smaller);
    e->q = 100 * sqrt(q / q_var), e->qd = 100 * sqrt(qd / qd_var);
    e->median = 100 * sqrt(each[(count - 1) / 2] / (q_var / count));
    e->most = 100 * sqrt(each[(9 * count - 1) / 10] / (q_var / count));
    free(start), free(at), free(windows), free(each);
    return st;
}

/* Largest |E(t) - E(0) - work| over the largest T along the model's own roll-outs of whole trajectories, in percent. */
static double drift(const any *a, const motion *d, int forces)
{
    const int N = d->dof, n = a->md->lnn.n;
    double worst = 0;
    for (int k = 0; k < d->count; k++) {
        const size_t at = (size_t)(k * d->samples) * (size_t)N;
        roln_real s[8], s0[8], tau_z[4];
        double E[2], E0 = 0, work = 0, off = 0, top = 0;
        if (a->encode(a->p, d->q + at, d->qd + at, s) != ROLN_OK) return 1e9;
        for (int t = 0; t < d->samples; t++) {
            const roln_real *tau = forces ? d->tau + at + (size_t)(t * N) : NULL;
            if (a->energy(a->p, s, E) != ROLN_OK) return 1e9;
            if (t == 0) E0 = E[0] + E[1];
            top = fmax(top, E[0]);
            off = fmax(off, fabs(E[0] + E[1] - E0 - work));
            memcpy(s0, s, sizeof s0);
            if (a->step(a->p, s, tau) != ROLN_OK) return 1e9;
            if (tau && a->reduce(a->p, s0, tau, tau_z) == ROLN_OK)
                for (int i = 0; i < n; i++)
                    work += (double)(tau_z[i] * (s[i] - s0[i]));
        }
        worst = fmax(worst, off / top);
    }
    return 100 * worst;
}

static void table(const char *name, const any *a, const motion *d, int forces)
{
    static const int ms[] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2999};
    figures e;
    printf("%s\n    horizon    E_q %%  median     90 %%   E_qd %%\n", name);
    for (size_t i = 0; i < sizeof ms / sizeof *ms; i++) {
        CHECK(errors(a, d, forces, ms[i], &e) == ROLN_OK);
        printf("  %6d ms %8.3f %7.3f %8.3f %8.3f\n", ms[i], e.q, e.median, e.most, e.qd);
    }
    CHECK(errors(a, d, forces, -1, &e) == ROLN_OK);
    printf("  whole 3 s %8.3f %7.3f %8.3f %8.3f   energy drift %.3f %% of max T\n", e.q, e.median, e.most, e.qd,
           drift(a, d, forces));
}

/* E_q of the trivial predictor q + h qd, %. */
static double trivial(const motion *d, int h)
{
    double e = 0, v = 0;
    for (int k = 0; k < d->count; k++)
        for (int i = 0; i + h < d->samples; i += 25)
            for (int j = 0; j < d->dof; j++) {
                const size_t p = (size_t)((k * d->samples + i) * d->dof + j), f = p + (size_t)(h * d->dof);
                const double r = (double)(d->q[p] + ROLN_C(1e-3) * (roln_real)h * d->qd[p] - d->q[f]);
                const double c = (double)(d->q[f] - d->qbar[j]);
                e += r * r, v += c * c;
            }
    return 100 * sqrt(e / v);
}

/* Largest |rho(phi(z)) - z| of a coordinate, over states drawn from the box of z_min, z_max. */
static double given_back(const any *a, const roln_real *z_min, const roln_real *z_max)
{
    const int n = a->md->lnn.n;
    double top = 0;
    uint64_t seed = 3;
    for (int k = 0; k < 20000; k++) {
        roln_real s[8] = {0}, back[8], q[16], qd[16];
        for (int i = 0; i < n; i++)
            s[i] = z_min[i] + (z_max[i] - z_min[i]) * roln_uniform(&seed);
        CHECK(a->decode(a->p, s, q, qd) == ROLN_OK);
        CHECK(a->encode(a->p, q, qd, back) == ROLN_OK);
        for (int i = 0; i < n; i++)
            top = fmax(top, fabs((double)(back[i] - s[i])));
    }
    return top;
}

/* One row of the table of stored weights; bound: of E_q at 0 and 25 ms and whole, %, and of what encoding a decoded state gives
   back. */
static void stored(const char *name, const any *a, const motion *d, const pend16_params *range, size_t bytes, const double bound[4])
{
    static const int h[3] = {0, 25, -1};
    const double off = given_back(a, range->z_min, range->z_max);
    figures e[3];
    for (int i = 0; i < 3; i++) {
        CHECK(errors(a, d, 0, h[i], &e[i]) == ROLN_OK);
        CHECK_BELOW(e[i].q, bound[i]);
    }
    CHECK_BELOW(off, bound[3]);
    printf("  stored %-5s %6d bytes of flash, autoencoder %5d; E_q 0 ms %.3f, 25 ms %.3f, whole %.2f %%; rho(phi(z)) off by %.1e\n",
           name, (int)bytes, (int)sizeof(roln_real) * roln_ae_params(&a->md->ae), e[0].q, e[1].q, e[2].q, off);
}

/* What a chart has to do better than. */
static void check_pod(const motion *d)
{
    printf("  to compare: POD with n = 4 leaves %.1f %%, q + h qd at 25 ms %.2f %%\n", d->pod, trivial(d, 25));
    CHECK(d->pod > 15 && d->pod < 25);
}

static void test_pend16(void)
{
    static pend16_half_params half;
    static pend16_half_start half_work;
    static pend16_int8_params int8;
    static pend16_int8_start int8_work;
    static pend16_params p;
    static unsigned char bytes[pend16_packed_size];
    motion d = simulate(TRUTH_PEND16, 100);
    const any a = pend16_any(&p);
    figures e;
    const int count = load(FOLDER "pend16.roln", bytes, sizeof bytes);
    if (!d.q || !CHECK(pend16_unpack(count, bytes, &p) == ROLN_OK)) return;
    table("pend16 free, n = 4, no forces given", &a, &d, 0);
    check_pod(&d);
    CHECK(errors(&a, &d, 0, 25, &e) == ROLN_OK);
    CHECK_BELOW(e.q, PEND16_EQ25);
    CHECK_BELOW(e.qd, PEND16_EQD25);
    CHECK(errors(&a, &d, 0, 1000, &e) == ROLN_OK);
    CHECK_BELOW(e.q, PEND16_EQ1000);
    if (CHECK(pend16_half_quantise(count, bytes, &half, &half_work.quantise) == ROLN_OK) &&
        CHECK(pend16_int8_quantise(count, bytes, &int8, &int8_work.quantise) == ROLN_OK)) {
        const any h = pend16_half_any(&half);
        const any i = pend16_int8_any(&int8);
        stored("full", &a, &d, &p, sizeof p, (const double[]){.01, .05, 5, 1e-6});
        stored("half", &h, &d, &p, sizeof half, (const double[]){.05, .06, 5, 1e-6});
        stored("int8", &i, &d, &p, sizeof int8, (const double[]){1, 1, 7, 1e-4});
        for (int k = 0; k < pend16_n; k++) /* as docs/firmware.md says */
            CHECK_BELOW(p.z_max[k] - p.z_min[k], 2.2);
    }
    release(&d);
}

/* rms over poses of |M - s M_true|_F / |M_true|_F; with torques s = 1, else s is fitted. */
static double mass_error(const pend2_params *p, const motion *d, int fit)
{
    double mt = 0, tt = 0, err = 0, s = 1;
    int count = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < d->count * d->samples; k += 97) {
            double q[2], rest[2] = {0, 0}, Mt[4], c[2], g[2], diff = 0, norm = 0;
            pend2_equation e;
            pend2_state x;
            pend2_latent z;
            memcpy(x.q, d->q + 2 * k, sizeof x.q);
            memset(x.qd, 0, sizeof x.qd);
            q[0] = (double)x.q[0], q[1] = (double)x.q[1];
            if (truth_terms_pend2(q, rest, Mt, c, g) != 0 || pend2_encode(p, &x, &z, &pend2_room.work.encode) != ROLN_OK ||
                pend2_dynamics(p, &z, &e, &pend2_room.work.dynamics) != ROLN_OK)
                return 1e9;
            for (int i = 0; i < 4; i++) { /* z = q / scale.q: M_q = M_z / scale.q^2 */
                const double m = (double)(e.M[i] / (p->scale.q * p->scale.q));
                if (pass == 0) mt += m * Mt[i], tt += Mt[i] * Mt[i];
                diff += (m - s * Mt[i]) * (m - s * Mt[i]), norm += s * Mt[i] * s * Mt[i];
            }
            if (pass == 1) err += diff / norm, count++;
        }
        if (fit) s = mt / tt;
    }
    return 100 * sqrt(err / count);
}

static void test_pend2(enum truth_system system, const char *file, int forces)
{
    static pend2_params p;
    static unsigned char bytes[pend2_packed_size];
    motion d = simulate(system, 40);
    const any a = pend2_any(&p);
    double mass;
    figures e;
    char path[256];
    snprintf(path, sizeof path, FOLDER "%s.roln", file);
    if (!d.q || !CHECK(pend2_unpack(load(path, bytes, sizeof bytes), bytes, &p) == ROLN_OK)) return;
    table(file, &a, &d, forces);
    mass = mass_error(&p, &d, !forces);
    printf("  M error %.3f %%\n", mass);
    CHECK(errors(&a, &d, forces, -1, &e) == ROLN_OK);
    CHECK_BELOW(e.q, 0.15);
    CHECK_BELOW(mass, 0.05);
    release(&d);
}

static void test_wave16(void)
{
    motion d = simulate(TRUTH_WAVE16, 100);
    if (!d.q) return;
    printf("wave16 free\n");
    check_pod(&d);
    release(&d);
}

void test_models(void)
{
    test_pend16();
    test_wave16();
    test_pend2(TRUTH_PEND2, "pend2_free", 0);
    test_pend2(TRUTH_PEND2_ACT, "pend2_act", 1);
}
