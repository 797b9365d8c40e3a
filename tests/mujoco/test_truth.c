/* SPDX-License-Identifier: MIT */
/* Ground truth: equations of motion, manifold, energy and power, couplings against MuJoCo's own, random streams, HDF5. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "../unit/check.h"
#include "h5.h"

void test_truth(void);

#define PI 3.14159265358979323846
#define SEED 7
#define COUNT 6

static int make(struct truth_set *s, enum truth_system system, enum truth_split split, int first, int count, int samples)
{
    return CHECK(truth_generate(s, system, split, SEED, first, count, samples) == 0);
}

/* Two rods 1 kg, 1 m, relative angles, by hand: M, V, T and M qdd + C + G = tau. */
static void check_pend2_formula(const struct truth_set *s)
{
    const double g = 9.81;
    double worst_M = 0, worst_E = 0, worst_f = 0;
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row += 7) {
        const double *q = s->q + 2 * row, *v = s->qd + 2 * row, *a = s->qdd + 2 * row, *tau = s->tau + 2 * row;
        double c = cos(q[1]), k = .5 * sin(q[1]), M[4], cm[2], gm[2];
        const double truth[4] = {5. / 3 + c, 1. / 3 + c / 2, 1. / 3 + c / 2, 1. / 3};
        double V = -g * (1.5 * cos(q[0]) + .5 * cos(q[0] + q[1])), T = 0;
        double G[2] = {g * (1.5 * sin(q[0]) + .5 * sin(q[0] + q[1])), g * .5 * sin(q[0] + q[1])};
        double C[2] = {-k * v[1] * (2 * v[0] + v[1]), k * v[0] * v[0]};
        truth_terms_pend2(q, v, M, cm, gm);
        for (int i = 0; i < 4; i++) {
            worst_M = fmax(worst_M, fabs(M[i] - truth[i]));
            T += .5 * truth[i] * v[i / 2] * v[i % 2];
        }
        for (int i = 0; i < 2; i++)
            worst_f = fmax(worst_f, fmax(fabs(cm[i] - C[i]), fabs(gm[i] - G[i])));
        for (int i = 0; i < 2; i++)
            worst_f = fmax(worst_f, fabs(truth[2 * i] * a[0] + truth[2 * i + 1] * a[1] + C[i] + G[i] - tau[i]));
        worst_E = fmax(worst_E, fmax(fabs(T - s->e_kin[row]), fabs(V - s->e_pot[row])));
    }
    CHECK_BELOW(worst_M, 1e-14);
    CHECK_BELOW(worst_E, 1e-12);
    CHECK_BELOW(worst_f, 1e-12);
}

/* q = phi(z), qd = J zd, T = zd' Mz zd / 2, V(z) = e_pot: the reduced truth is the truth of the samples. */
static void check_reduced(const struct truth_set *s)
{
    double worst_q = 0, worst_E = 0;
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row += 17) {
        const double *z = s->z + 4 * row, *zd = s->zd + 4 * row;
        double q[16], J[64], M[16], V = 0, T = 0;
        truth_phi(s->system, z, q, J);
        truth_reduced(s->system, z, M, &V);
        for (int i = 0; i < 16; i++) {
            double qd = 0;
            for (int b = 0; b < 4; b++) qd += J[4 * i + b] * zd[b];
            T += .5 * M[i] * zd[i / 4] * zd[i % 4];
            worst_q = fmax(worst_q, fmax(fabs(q[i] - s->q[16 * row + (size_t)i]), fabs(qd - s->qd[16 * row + (size_t)i])));
        }
        worst_E = fmax(worst_E, fmax(fabs(T - s->e_kin[row]), fabs(V - s->e_pot[row])));
    }
    CHECK_BELOW(worst_q, 0);
    CHECK_BELOW(worst_E, 1e-12);
}

/* Central differences are off by O(h^2): halving h quarters that. off: its squares, summed, at h and at h / 2. */
static void check_slope(const double off[2], double bound)
{
    CHECK_BELOW(sqrt(off[0]), bound);
    CHECK_NEAR(sqrt(off[0] / off[1]), 4, .02);
}

/* Some point of the ranges that the blocks have, 0 included. */
static void pose(int k, double z[4])
{
    static const double range[4] = {1, 1, 1, 2};
    for (int b = 0; b < 4; b++) z[b] = range[b] * sin(k * (1.1 + .37 * b));
}

/* phi(0) = 0, first joints are z, J is the derivative of phi; the ninth differences of the other joints by their block's z vanish
   for pend16 alone, whose couplings have degree 4. */
static void check_phi(enum truth_system system)
{
    enum { POSES = 50, NINTH = 9 };
    double off[2] = {0, 0}, apart[16], least = HUGE_VAL, most = 0;
    int first = 1, zero = 1;
    for (int k = 0; k < POSES; k++) {
        double z[4], q[16], J[64], side[2][16];
        pose(k, z);
        truth_phi(system, z, q, J);
        for (int i = 0; i < 16; i++) first &= i % 4 || q[i] == z[i / 4], zero &= k > 0 || q[i] == 0;
        for (int b = 0; b < 4; b++)
            for (int step = 0; step < 2; step++) {
                const double h = .02 / (1 + step);
                for (int s = 0; s < 2; s++) {
                    double to[4];
                    memcpy(to, z, sizeof to);
                    to[b] += s ? h : -h;
                    truth_phi(system, to, side[s], NULL);
                }
                for (int i = 0; i < 16; i++) off[step] += pow((side[1][i] - side[0][i]) / (2 * h) - J[4 * i + b], 2);
            }
    }
    CHECK(first);
    CHECK(zero);
    check_slope(off, 4e-3);

    memset(apart, 0, sizeof apart);
    for (int k = 0, binomial = 1; k <= NINTH; binomial = binomial * (NINTH - k) / (k + 1), k++) {
        const double x = -1 + .3 * k, z[4] = {x, x, x, x};
        double q[16];
        truth_phi(system, z, q, NULL);
        for (int i = 0; i < 16; i++) apart[i] += (k % 2 ? -1 : 1) * binomial * q[i];
    }
    for (int i = 0; i < 16; i++)
        if (i % 4) least = fmin(least, fabs(apart[i])), most = fmax(most, fabs(apart[i]));
    if (system == TRUTH_WAVE16) CHECK(least > 1e-5);
    else CHECK_BELOW(most, 1e-13);
}

/* Places of the middles of 16 rods of .125 m and their angles from hanging: x [16], height [16], angle [16]. */
static void rods(const double q[16], double at[48])
{
    const double l = .125;
    double x = 0, y = 0, angle = 0;
    for (int i = 0; i < 16; i++) {
        angle += q[i];
        at[i] = x + l / 2 * sin(angle), at[16 + i] = y - l / 2 * cos(angle), at[32 + i] = angle;
        x += l * sin(angle), y -= l * cos(angle);
    }
}

/* The reduced mass and potential from these places alone, M by central differences over z: M_ab is the sum over the rods of
   m <dx/dz_a, dx/dz_b> + I dangle/dz_a dangle/dz_b. */
static void check_rods(enum truth_system system)
{
    const double m = .125, inertia = .125 * .125 * .125 / 12;
    double off[2] = {0, 0}, worst_V = 0, z[4], q[16], M[16], V = 0, at[48], d[4][48];
    pose(0, z);
    CHECK(truth_reduced(TRUTH_PEND2, z, M, &V) == -1);
    for (int k = 0; k < 20; k++) {
        pose(k, z);
        if (!CHECK(truth_reduced(system, z, M, &V) == 0)) return;
        truth_phi(system, z, q, NULL);
        rods(q, at);
        for (int i = 0; i < 16; i++) V -= m * 9.81 * at[16 + i];
        worst_V = fmax(worst_V, fabs(V));
        for (int step = 0; step < 2; step++) {
            const double h = .01 / (1 + step);
            for (int b = 0; b < 4; b++)
                for (int s = -1; s < 2; s += 2) {
                    double to[4];
                    memcpy(to, z, sizeof to);
                    to[b] += s * h;
                    truth_phi(system, to, q, NULL);
                    rods(q, at);
                    for (int i = 0; i < 48; i++) d[b][i] = (s > 0 ? d[b][i] : 0) + s * at[i] / (2 * h);
                }
            for (int e = 0; e < 16; e++) {
                double sum = 0;
                for (int i = 0; i < 48; i++) sum += (i < 32 ? m : inertia) * d[e / 4][i] * d[e % 4][i];
                off[step] += pow(sum - M[e], 2);
            }
        }
    }
    CHECK_BELOW(worst_V, 2e-14);
    check_slope(off, 1e-2);
}

/* qdd = J zdd + (dJ/dt) zd, dJ/dt by central differences of J along zd; zdd is what the first joints say. */
static void check_acceleration(const struct truth_set *s)
{
    double off[2] = {0, 0}, top = 0;
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row += 17) {
        const double *z = s->z + 4 * row, *zd = s->zd + 4 * row, *qdd = s->qdd + 16 * row;
        double q[16], J[64], side[2][64];
        truth_phi(s->system, z, q, J);
        for (int step = 0; step < 2; step++) {
            const double h = 2e-3 / (1 + step);
            for (int k = 0; k < 2; k++) {
                double to[4];
                for (int b = 0; b < 4; b++) to[b] = z[b] + (k ? h : -h) * zd[b];
                truth_phi(s->system, to, q, side[k]);
            }
            for (int i = 0; i < 16; i++) {
                double a = 0;
                for (int b = 0; b < 4; b++)
                    a += J[4 * i + b] * qdd[4 * b] + (side[1][4 * i + b] - side[0][4 * i + b]) / (2 * h) * zd[b];
                off[step] += pow(qdd[i] - a, 2);
                top += qdd[i] * qdd[i] / 2;
            }
        }
    }
    off[0] /= top, off[1] /= top;
    check_slope(off, 2e-4);
}

/* Rope and cloth from the beads' places alone: V and its gradient by the springs' lengths, T; M qdd + dV/dq = tau, M = mass 1. */
static void check_grid_formula(const struct truth_set *s)
{
    static const int axis[2][3] = {{2, 1, 0}, {0, 1, 2}};       /* of the sliders; the rope's first points down */
    static double x[600], f[600];
    const int rope = s->system == TRUTH_ROPE, still = 3 * rope;
    const double m = rope ? .005 : .001, main_spring = rope ? 2000 : 100, stiffness[3] = {main_spring, main_spring, 20};
    const double length[3] = {.02, .02, .02 * sqrt(2)};
    double worst_E = 0, worst_f = 0;
    int columns, rows;
    if (!CHECK(truth_grid(s->system, &columns, &rows) == 0) || !CHECK(3 * columns * rows == s->dof + still)) return;
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row += 7) {
        const size_t n = (size_t)s->dof;
        double V = 0, T = 0;
        truth_beads(s->system, s->q + row * n, x);
        memset(f, 0, sizeof f);
        for (int b = 0; b < columns * rows; b++) {
            V += m * 9.81 * x[3 * b + 2];
            f[3 * b + 2] += m * 9.81;
            for (int k = 0; k < 3; k++) {       /* column + 1, row + 1, both */
                const int c = b / rows + (k != 1), r = b % rows + (k != 0), o = c * rows + r;
                double e[3], l = 0;
                if (c == columns || r == rows) continue;
                for (int i = 0; i < 3; i++) e[i] = x[3 * o + i] - x[3 * b + i], l += e[i] * e[i];
                l = sqrt(l);
                V += .5 * stiffness[k] * (l - length[k]) * (l - length[k]);
                for (int i = 0; i < 3; i++) {
                    const double force = stiffness[k] * (l - length[k]) * e[i] / l;
                    f[3 * b + i] -= force, f[3 * o + i] += force;
                }
            }
        }
        for (int i = still; i < 3 * columns * rows; i++) {
            const size_t j = row * n + (size_t)(i - still);
            const double g = f[i / 3 * 3 + axis[!rope][i % 3]] * (rope && i % 3 == 0 ? -1 : 1);
            T += .5 * m * s->qd[j] * s->qd[j];
            worst_f = fmax(worst_f, fabs(m * s->qdd[j] + g - s->tau[j]));
        }
        worst_E = fmax(worst_E, fmax(fabs(T - s->e_kin[row]), fabs(V - s->e_pot[row])));
    }
    CHECK_BELOW(worst_E, 1e-12);
    CHECK_BELOW(worst_f, 3e-12);
}

/* The rope starts straight and tilted; the cloth starts flat and touches nothing for .1 s, about 5 cm. Both at rest. */
static void check_start(const struct truth_set *s)
{
    static double x[600];
    const size_t size = (size_t)s->samples * (size_t)s->dof;
    int rest = 1, placed = 1;
    for (size_t j = 0; j < (size_t)s->count; j++) {
        const double *q = s->q + j * size, *u = s->tau_model + j * size;
        for (int i = 0; i < s->dof; i++) rest &= s->qd[j * size + (size_t)i] == 0;
        truth_beads(s->system, q, x);
        if (s->system == TRUTH_ROPE) {
            const double tilt = acos(-x[5] / .02);
            placed &= tilt >= .24 && tilt <= .8;
            for (int i = 0; i < 3 * 65; i++) placed &= fabs(x[i] - i / 3 * x[3 + i % 3]) < 1e-14;
        } else {
            size_t touch = 0;
            for (size_t i = 0; i < (size_t)s->dof; i++) placed &= q[i] == q[i % 3];
            placed &= fabs(q[0]) <= .01 && fabs(q[1]) <= .01 && fabs(x[2] - .155) < 1e-15;
            while (touch < size && fabs(u[touch]) < 1e-9) touch++;
            placed &= touch / (size_t)s->dof >= 100 && touch / (size_t)s->dof <= 104;
        }
    }
    CHECK(rest);
    CHECK(placed);
}

/* qd and qdd are the derivatives of q and qd (trapezoidal rule over each step); torques act where they must and nowhere else. */
static void check_signals(const struct truth_set *s)
{
    size_t n = (size_t)s->dof;
    double dq = 0, dv = 0, v_max = 0, a_max = 0, h = s->dt;
    int undriven = 1, driven = 0;
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row++) {
        int last = (row + 1) % (size_t)s->samples == 0;
        for (size_t i = 0; i < n; i++) {
            const double *q = s->q + row * n + i, *v = s->qd + row * n + i, *a = s->qdd + row * n + i;
            double u = s->tau_model[row * n + i];
            v_max = fmax(v_max, fabs(*v));
            a_max = fmax(a_max, fabs(*a));
            if (!last) dq = fmax(dq, fabs(q[n] - q[0] - h / 2 * (v[0] + v[n])));
            if (!last) dv = fmax(dv, fabs(v[n] - v[0] - h / 2 * (a[0] + a[n])));
            if ((s->system == TRUTH_PEND16_ACT || s->system == TRUTH_PEND16_PD) && i % 4) undriven &= u == 0;
            else driven |= u != 0;
        }
    }
    const int cloth = s->system == TRUTH_CLOTH;
    CHECK_BELOW(dq / (h * v_max), cloth ? 2e-2 : 5e-4);
    if (s->system != TRUTH_PEND16_PD && !cloth)         /* there force and qdd jump: with every sample, at contacts */
        CHECK_BELOW(dv / (h * a_max), s->system == TRUTH_ROPE ? 1e-2 : 3e-3);
    CHECK(undriven);
    CHECK(driven == (s->system == TRUTH_PEND2_ACT || s->system == TRUTH_PEND16_ACT || s->system == TRUTH_PEND16_PD || cloth));
}

/* Trajectory b of s starts with trajectory a of r, bit for bit, in every vector. */
static int same_trajectory(const struct truth_set *r, int a, const struct truth_set *s, int b)
{
    const double *p[] = {r->q, r->qd, r->qdd, r->tau, r->tau_model}, *o[] = {s->q, s->qd, s->qdd, s->tau, s->tau_model};
    const size_t size = (size_t)r->samples * (size_t)r->dof, whole = (size_t)s->samples * (size_t)s->dof;
    int same = size <= whole;
    for (int i = 0; i < 5 && same; i++) same = !memcmp(p[i] + (size_t)a * size, o[i] + (size_t)b * whole, size * sizeof(double));
    return same;
}

/* A trajectory does not depend on the others, nor a sample, to its mean force, on those that follow; other splits have others. */
static void check_reproducible(const struct truth_set *s, int samples)
{
    const int last = s->count - 1;
    for (int i = 0; i < TRUTH_SPLITS; i++) {
        struct truth_set one;
        if (!make(&one, s->system, (enum truth_split)i, last, 1, samples)) continue;
        CHECK(same_trajectory(&one, 0, s, last) == (i == TRUTH_TRAIN));
        truth_free(&one);
    }
    CHECK(!same_trajectory(s, 0, s, 1));
}

/* MuJoCo's soft couplings know nothing of J and its derivative: relative error of q over 3 s. A trajectory whose last block whips
   round amplifies the difference about tenfold, hence two bounds. */
static void check_soft(const struct truth_set *exact, enum truth_system system)
{
    struct truth_set soft;
    struct truth_report r;
    double worst = 0;
    int close = 0;
    if (!make(&soft, system, TRUTH_TRAIN, 0, COUNT, exact->samples)) return;
    CHECK(truth_check(&soft, &r) == 0);
    CHECK_BELOW(r.residual, 3e-13);
    for (size_t j = 0, n = 16 * (size_t)exact->samples; j < COUNT; j++) {
        double d2 = 0, q2 = 0;
        for (size_t i = j * n; i < (j + 1) * n; i++) {
            d2 += (soft.q[i] - exact->q[i]) * (soft.q[i] - exact->q[i]);
            q2 += exact->q[i] * exact->q[i];
        }
        close += d2 <= 5e-4 * 5e-4 * q2;
        worst = fmax(worst, sqrt(d2 / q2));
    }
    CHECK_BELOW(worst, 5e-3);
    CHECK(close >= COUNT / 2);
    truth_free(&soft);
}

static char *slurp(const char *path, long *size)
{
    FILE *f = fopen(path, "rb");
    if (!f) return NULL;
    fseek(f, 0, SEEK_END);
    *size = ftell(f);
    rewind(f);
    char *bytes = malloc((size_t)*size);
    if (bytes && fread(bytes, 1, (size_t)*size, f) != (size_t)*size) *size = -1;
    fclose(f);
    return bytes;
}

static int same_set(const struct truth_set *a, const struct truth_set *b)
{
    size_t rows = (size_t)a->count * (size_t)a->samples;
    double *sa[] = {a->t, a->e_kin, a->e_pot}, *sb[] = {b->t, b->e_kin, b->e_pot};
    int same = a->system == b->system && a->count == b->count && a->samples == b->samples && a->dt == b->dt
        && a->dt_sim == b->dt_sim && a->seed == b->seed && !strcmp(a->model_xml, b->model_xml);
    for (int i = 0; i < 3 && same; i++) same = !memcmp(sa[i], sb[i], rows * sizeof(double));
    for (int j = 0; j < a->count && same; j++) same = same_trajectory(a, j, b, j);
    if (a->latent && same)
        same = !memcmp(a->z, b->z, 4 * rows * sizeof(double)) && !memcmp(a->zd, b->zd, 4 * rows * sizeof(double));
    return same;
}

static void check_round_trip(const char *path, const struct truth_set sets[TRUTH_SPLITS])
{
    struct truth_set back[TRUTH_SPLITS];
    if (!CHECK(truth_h5_read(path, back) == 0)) return;
    for (int i = 0; i < TRUTH_SPLITS; i++) {
        CHECK(same_set(&sets[i], &back[i]));
        truth_free(&back[i]);
    }
}

static void check_h5(enum truth_system system)
{
    static const char *const path[2] = {"test_truth_0.h5", "test_truth_1.h5"};
    struct truth_set sets[TRUTH_SPLITS];
    char *bytes[2];
    long size[2] = {0, -1};
    for (int i = 0; i < TRUTH_SPLITS; i++)
        if (!make(&sets[i], system, (enum truth_split)i, 0, 4 - i, 1000 - 10 * i)) return;

    CHECK(truth_h5_write(path[0], sets) == 0);
    for (time_t start = time(NULL); time(NULL) == start;) {}    /* time stamps, if any, have seconds */
    CHECK(truth_h5_write(path[1], sets) == 0);
    for (int i = 0; i < 2; i++) bytes[i] = slurp(path[i], &size[i]);
    CHECK(bytes[0] && bytes[1] && size[0] == size[1] && !memcmp(bytes[0], bytes[1], (size_t)size[0]));
    free(bytes[0]);
    free(bytes[1]);

    check_round_trip(path[1], sets);
    for (int i = 0; i < TRUTH_SPLITS; i++) truth_free(&sets[i]);
    remove(path[0]);
    remove(path[1]);
}

/* ---- random streams, by where pend2 starts: two draws per trajectory, uniform in +-pi/2 ---- */

enum { STREAM = 2000 };

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static int starts(double x[2 * STREAM], enum truth_split split, uint64_t seed)
{
    struct truth_set s;
    if (!CHECK(truth_generate(&s, TRUTH_PEND2, split, seed, 0, STREAM, 1) == 0)) return 0;
    memcpy(x, s.q, 2 * STREAM * sizeof *x);
    truth_free(&s);
    return 1;
}

/* Correlation of a with b, uniform in +-pi/2, b `later` trajectories on. */
static double correlation(const double *a, const double *b, int later)
{
    double sum = 0;
    const int n = 2 * (STREAM - later);
    for (int i = 0; i < n; i++) sum += a[i] * b[i + 2 * later];
    return sum / n / (PI * PI / 12);
}

/* Train and test are today what they always were. No number occurs in two streams, of neighbouring seeds either, nor twice in one,
   which it would if two streams overlapped; and none tells anything of another: four standard deviations. */
static void check_streams(void)
{
    enum { SETS = 4 * TRUTH_SPLITS, ONE = 2 * STREAM }; /* set i: seed i / TRUTH_SPLITS, split i % TRUTH_SPLITS */
    static const double always[2][2] = {{0x1.5bb63275e1c32p+0, -0x1.484e851fef9e7p+0}, {0x1.daa2c61fcb2e8p-2, 0x1.dd10541cb238p-7}};
    static double x[SETS * ONE];
    const double bound = 4 / sqrt(ONE);
    int same = 0;
    for (int i = 0; i < SETS; i++)
        if (!starts(x + i * ONE, (enum truth_split)(i % TRUTH_SPLITS), (uint64_t)(i / TRUTH_SPLITS))) return;
    CHECK(!memcmp(x + (TRUTH_SPLITS + TRUTH_TRAIN) * ONE + 6, always[0], sizeof always[0]));
    CHECK(!memcmp(x + (TRUTH_SPLITS + TRUTH_TEST) * ONE + 6, always[1], sizeof always[1]));
    for (int i = 0; i < SETS; i++) {
        const double *a = x + i * ONE;
        double mean = 0;
        for (int k = 0; k < ONE; k++) mean += a[k] / ONE;
        CHECK_BELOW(fabs(mean) / (PI / sqrt(12)), bound);
        CHECK_BELOW(fabs(correlation(a, a, 0) - 1), bound);
        CHECK_BELOW(fabs(correlation(a, a, 1)), bound);
        for (int j = 0; j < i; j++)
            for (int later = 0; later < 2; later++) CHECK_BELOW(fabs(correlation(a, x + j * ONE, later)), bound);
    }
    qsort(x, SETS * ONE, sizeof *x, ascending);
    for (int i = 1; i < SETS * ONE; i++) same += x[i] == x[i - 1];
    CHECK(same == 0);
}

static void check_grid(enum truth_system system)
{
    static const char path[] = "test_truth_grid.h5";
    struct truth_set s, sets[TRUTH_SPLITS];
    struct truth_report r;
    int columns, rows;
    if (!make(&s, system, TRUTH_TRAIN, 0, 2, truth_samples(system))) return;
    CHECK(truth_check(&s, &r) == 0);
    CHECK_BELOW(r.residual, 3e-13);
    CHECK_BELOW(r.energy, system == TRUTH_ROPE ? 1e-8 : 1e-2);     /* work of a mean force knows nothing of what happens in 1 ms */
    CHECK_BELOW(r.impulse, 3e-15);
    check_signals(&s);
    check_reproducible(&s, 130);
    check_grid_formula(&s);
    check_start(&s);
    CHECK(truth_grid(TRUTH_PEND2, &columns, &rows) == -1 && truth_beads(TRUTH_PEND2, s.q, s.qd) == -1);
    for (int i = 0; i < TRUTH_SPLITS; i++) sets[i] = s;
    CHECK(truth_h5_write(path, sets) == 0);
    check_round_trip(path, sets);
    remove(path);
    truth_free(&s);
}

/* MuJoCo's own step repeats the trajectories; longer ones are further off, and too long ones unstable. */
static void check_time(enum truth_system system, int samples, double longer, double unstable)
{
    struct truth_set s;
    double us = 0, own = 1, off = 0, further = 0;
    if (!make(&s, system, TRUTH_TEST, 0, 2, samples)) return;
    CHECK(truth_time(&s, s.dt_sim, &us, &own) == 0);
    CHECK_BELOW(own, 1e-12);
    CHECK(us > .1 && us < 1e4);
    CHECK(truth_time(&s, longer, NULL, &off) == 0 && truth_time(&s, 2 * longer, NULL, &further) == 0);
    CHECK(off > own && further > 2 * off && further < .1);
    if (unstable > 0) CHECK(truth_time(&s, unstable, NULL, &off) == 1);
    CHECK(truth_time(&s, s.dt_sim, NULL, &off) == 0 && off == own);
    truth_free(&s);
}

void test_truth(void)
{
    static const enum truth_system systems[] = {TRUTH_PEND2,      TRUTH_PEND2_ACT, TRUTH_PEND16,
                                                TRUTH_PEND16_ACT, TRUTH_PEND16_PD, TRUTH_WAVE16};
    check_streams();
    for (size_t i = 0; i < sizeof systems / sizeof *systems; i++) {
        struct truth_set s;
        struct truth_report r;
        if (!make(&s, systems[i], TRUTH_TRAIN, 0, COUNT, truth_samples(systems[i]))) continue;
        CHECK(truth_check(&s, &r) == 0);
        CHECK_BELOW(r.residual, systems[i] == TRUTH_PEND16_PD ? 3e-14 * r.force_max : 3e-13);
        CHECK_BELOW(r.ideal, systems[i] == TRUTH_PEND16_PD ? 3e-14 * r.force_max : 1e-12);  /* J^T (tau - tau_model) = 0 */
        CHECK_BELOW(r.energy, 2e-7);        /* energy is constant, or changes by the work of the held torques */
        check_signals(&s);
        check_reproducible(&s, s.samples);
        if (s.dof == 2) check_pend2_formula(&s);
        else {
            check_reduced(&s);
            check_acceleration(&s);
        }
        if (systems[i] == TRUTH_PEND16 || systems[i] == TRUTH_WAVE16) {
            check_phi(systems[i]);
            check_rods(systems[i]);
            check_soft(&s, systems[i] == TRUTH_PEND16 ? TRUTH_PEND16_SOFT : TRUTH_WAVE16_SOFT);
            check_h5(systems[i]);
        }
        truth_free(&s);
    }
    check_grid(TRUTH_ROPE);
    check_grid(TRUTH_CLOTH);
    check_time(TRUTH_PEND2, 1001, 1e-2, 0);
    check_time(TRUTH_ROPE, 61, 5e-4, 5e-3);
}
