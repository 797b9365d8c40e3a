/* SPDX-License-Identifier: MIT */
/* Mechanics, control and guard (roln.h sections 2 and 3): units and failures of every call, jets, inverse dynamics, power,
   apparent inertia, linearisation, PD+ control, allocation to motors, and the guard under fault injection. */
#ifndef ROLN_DOUBLE /* before small.h, whose dt their arguments would shadow */
#include "arm.h"
#include "arm_weights.h"
#include "furuta.h"
#include "furuta_weights.h"
#endif
#include "small.h"
#include <stdlib.h>

void TEST_NAME(control)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

static roln_real theta_k[MAXP]; /* parameters of the model under test */

static roln_trained of_model(int k)
{
    return trained(models[k].md, scale_of(k), theta_k);
}

/* A true autoencoder (the constraint holds) and a random network. */
static void valid(int k, uint64_t *s)
{
    parameters(k, s, theta_k);
    CHECK_OK(roln_ae_init(&models[k].md->ae, theta_k, s, ROOM(init)));
}

/* The same model, driven by tau, whatever its inputs; another integrator. */
static roln_model driven(int k, int scheme)
{
    roln_model m = *models[k].md;
    m.inputs = 0, m.scheme = scheme;
    return m;
}

/* ---- every call: units, work, failures -------------------------------------------------------- */

enum { ENCODE, DECODE, STEP, REDUCE, LIFT, TERMS_AT, RANGE, JET, INVERSE, INERTIA, LINEAR, CONTROL, ALLOCATE, FIT, CALLS };
enum { MOTORS = 2, MAXIN = 128, MAXOUT = 256, PARTS = 8 };

static const char *const call_names[CALLS] = {"encode", "decode",  "step",    "reduce", "lift",    "terms",    "fit_range",
                                              "aim",    "inverse", "inertia", "linear", "control", "allocate", "fit_scale"};

/* A run of numbers of one unit: q^q t^t m^m. */
typedef struct {
    int count, q, t, m;
} part;

/* What goes into a call and comes out of it, as numbers: parts one after the other, up to one of no numbers. */
typedef struct {
    part in[PARTS], out[PARTS];
} signature;

/* In units of q, of time and of inertia: z 0, 0, 0; zd 0, -1, 0; M 0, 0, 1; forces on z and energies 0, -2, 1; tau -1, -2, 1, for
   tau q is an energy, as tau_z is. */
static signature signature_of(int which, int k)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    const signature table[CALLS] = {
        /* ENCODE    */ {{{N, 1, 0, 0}, {N, 1, -1, 0}}, {{n, 0, 0, 0}, {n, 0, -1, 0}}},
        /* DECODE    */ {{{n, 0, 0, 0}, {n, 0, -1, 0}}, {{N, 1, 0, 0}, {N, 1, -1, 0}}},
        /* STEP      */ {{{n, 0, 0, 0}, {n, 0, -1, 0}, {F, -1, -2, 1}, {1, 0, 1, 0}}, {{n, 0, 0, 0}, {n, 0, -1, 0}}},
        /* REDUCE    */ {{{n, 0, 0, 0}, {F, -1, 0, 0}}, {{n, 0, 0, 0}}},
        /* LIFT      */ {{{n, 0, 0, 0}, {n, 1, 0, 0}}, {{N, 0, 0, 0}}},
        /* TERMS_AT  */ {{{n, 0, 0, 0}, {n, 0, -1, 0}}, {{n * n, 0, 0, 1}, {3 * n + 2, 0, -2, 1}}},
        /* RANGE     */ {{{3 * N, 1, 0, 0}, {3 * N, 1, -1, 0}}, {{2 * n, 0, 0, 0}, {n, 0, -1, 0}}},
        /* JET       */ {{{N, 1, 0, 0}, {N, 1, -1, 0}, {N, 1, -2, 0}}, {{n, 0, 0, 0}, {n, 0, -1, 0}, {n, 0, -2, 0}}},
        /* INVERSE   */ {{{n, 0, 0, 0}, {2 * n, 0, -1, 0}, {n, 0, -2, 0}}, {{n, 0, -2, 1}}},
        /* INERTIA   */ {{{n, 0, 0, 0}, {N, 1, 0, 0}}, {{N, -1, 0, 1}}},
        /* LINEAR    */ {{{n, 0, 0, 0}, {n, 0, -1, 0}, {F, -1, -2, 1}, {1, 0, 1, 0}},
                         {{n, 0, 0, 0}, {n, 0, -1, 0}}}, /* and A, B: linear_unit */
        /* CONTROL   */ {{{n, 0, 0, 0}, {n, 0, -1, 0}, {n, 0, 0, 0}, {n, 0, -1, 0}, {n, 0, -2, 0}, {n, 0, -2, 1}, {n, 0, -1, 1}},
                         {{n, 0, -2, 1}}},
        /* ALLOCATE  */ {{{2 * n + 1, 0, 0, 0}, {N * MOTORS, -1, 0, 0}}, {{MOTORS + 1, 0, 0, 0}}},
        /* FIT       */ {{{6 * N, 0, 0, 0}}, {{N + 2, 0, 0, 0}}},
    };
    return table[which];
}

static int numbers_of(const part *p)
{
    int i, sum = 0;
    for (i = 0; i < PARTS; i++)
        sum += p[i].count;
    return sum;
}

static roln_real unit_power(roln_real x, int e)
{
    roln_real y = 1;
    for (; e > 0; e--)
        y *= x;
    for (; e < 0; e++)
        y /= x;
    return y;
}

static const roln_scale *units; /* of the model under test */

/* The unit of number i of parts. */
static roln_real unit_of(const part *p, int i)
{
    for (; i >= p->count; p++)
        i -= p->count;
    return unit_power(units->q, p->q) * unit_power(units->t, p->t) * unit_power(units->m, p->m);
}

/* Units of what roln_linear gives beside the state: A [2n][2n], B [2n][F], row by row. */
static roln_real linear_unit(int n, int F, int i)
{
    const roln_real q = units->q, c = units->t;
    const int in_B = i >= 4 * n * n, columns = in_B ? F : 2 * n, row = (in_B ? i - 4 * n * n : i) / columns;
    const roln_real of_row = row < n ? 1 : 1 / c;
    if (in_B) return of_row * q * c * c / units->m;
    return of_row * (i % columns < n ? 1 : c);
}

/* Numbers of A and B. */
static int linear_numbers(int which, int k)
{
    return which == LINEAR ? 4 * n_OF(k) * n_OF(k) + 2 * n_OF(k) * F_OF(k) : 0;
}

/* Every function of prediction as one map from numbers to numbers. */
static roln_status call(int which, int k, const roln_trained *m, const roln_real *in, roln_real *out)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), nn = n * n;
    const roln_target ref = {in + 2 * n, in + 3 * n, in + 4 * n, in + 5 * n, in + 6 * n, NULL};
    const roln_motors motors = {MOTORS, in + 2 * n + 1, in[2 * n]};
    const roln_terms_out terms = {out, out + nn, out + nn + n, out + nn + 2 * n, out + nn + 3 * n, out + nn + 3 * n + 1};
    roln_real s[2 * MAXN];
    roln_scale fit = unit;
    roln_status st = ROLN_OK;
    memcpy(s, in, (size_t)(2 * n) * sizeof *s);
    switch (which) {
    case ENCODE: st = roln_encode(m, in, in + N, NULL, out, out + n, NULL, ROOM(encode)); break;
    case DECODE: st = roln_decode(m, in, in + n, out, out + N, ROOM(decode)); break;
    case STEP: st = roln_step(m, s, s + n, in + 2 * n, in[2 * n + F], ROOM(step)); break;
    case REDUCE: st = roln_reduce(m, in, in + n, out, ROOM(reduce)); break;
    case LIFT: st = roln_lift(m, in, in + n, out, ROOM(lift)); break;
    case TERMS_AT: st = roln_terms(m, in, in + n, &terms, ROOM(terms)); break;
    case RANGE: st = roln_fit_range(m, 3, in, in + 3 * N, out, out + n, out + 2 * n, ROOM(fit_range)); break;
    case JET: st = roln_encode(m, in, in + N, in + 2 * N, out, out + n, out + 2 * n, ROOM(aim)); break;
    case INVERSE: st = roln_inverse(m, in, in + n, in + 2 * n, in + 3 * n, out, ROOM(inverse)); break;
    case INERTIA: st = roln_inertia(m, in, in + n, out, ROOM(inertia)); break;
    case LINEAR: st = roln_linear(m, s, s + n, in + 2 * n, in[2 * n + F], out + 2 * n, out + 2 * n + 4 * nn, ROOM(linear)); break;
    case CONTROL: st = roln_control(m, in, in + n, &ref, out, ROOM(control)); break;
    case ALLOCATE: st = roln_allocate(m, in, &motors, in + n, out, out + MOTORS, ROOM(allocate)); break;
    default:
        room_of(0);
        st = roln_fit_scale(m->model, 3, in, in + 3 * N, out, &fit, NULL);
        out[N] = fit.q, out[N + 1] = fit.t;
        if (st != ROLN_OK) CHECK(same(3, &fit.q, &unit.q));
    }
    ROOM_KEPT();
    if (st != ROLN_OK) CHECK(same(2 * n, s, in)); /* the state of a step stays as it was */
    else if (which == STEP || which == LINEAR) memcpy(out, s, (size_t)(2 * n) * sizeof *s);
    return st;
}

/* Scales that are powers of two: the model of scales 1 gives the same bits from scaled numbers. */
static void check_units(int which, int k, const roln_real *in, const roln_real *out)
{
    const roln_trained plainly = trained(models[k].md, &unit, theta_k);
    const signature s = signature_of(which, k);
    const int n = n_OF(k), inputs = numbers_of(s.in), outputs = numbers_of(s.out);
    const int linear = linear_numbers(which, k);
    roln_real x[MAXIN], y[MAXOUT];
    int i, wrong = 0;
    for (i = 0; i < inputs; i++)
        x[i] = in[i] / unit_of(s.in, i);
    CHECK_OK(call(which, k, &plainly, x, y));
    for (i = 0; i < outputs + linear; i++) {
        const roln_real of = i < outputs ? unit_of(s.out, i) : linear_unit(n, F_OF(k), i - outputs);
        wrong += out[i] < of * y[i] || out[i] > of * y[i];
    }
    if (!CHECK(wrong == 0)) printf("    %s_%s: units\n", models[k].name, call_names[which]);
}

/* NaN, infinity and the edges of the range in every input: what comes out is finite, or nothing. */
static void check_edges(int which, int k, roln_real *in)
{
    const roln_real top = PICK(3.4028234e38f, 1.7976931348623157e308);
    const roln_real edge[8] = {
        (roln_real)NAN,     (roln_real)INFINITY, -(roln_real)INFINITY, top, -top, PICK(1e-45f, 4.9406564584124654e-324),
        PICK(1e19f, 1e154), PICK(-3e37f, -3e307)};
    const roln_trained m = of_model(k);
    const signature s = signature_of(which, k);
    const int inputs = numbers_of(s.in), outputs = numbers_of(s.out) + linear_numbers(which, k);
    roln_real out[MAXOUT];
    int i, b;
    for (i = 0; i < inputs; i++)
        for (b = 0; b < 8; b++) {
            const roln_real was = in[i];
            roln_status st;
            int ok;
            in[i] = edge[b];
            fill(MAXOUT, 7, out);
            st = call(which, k, &m, in, out);
            ok = st != ROLN_OK ? which == FIT || all(MAXOUT, out, 7) : b >= 3 && roln_all_finite(outputs, out);
            if (!CHECK(ok)) printf("    %s_%s, input %d, value %d\n", models[k].name, call_names[which], i, b);
            in[i] = was;
        }
}

/* A scale that is NaN, where it is used. */
static void check_scales(int which, int k, const roln_real *in)
{
    static const int uses_q[CALLS] = {1, 1, 0, 1, 1, 0, 1, 1, 0, 1, 1, 0, 1, 0},
                     uses_t[CALLS] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 1, 1, 0, 0},
                     uses_m[CALLS] = {0, 0, 1, 0, 0, 1, 0, 0, 1, 1, 1, 1, 0, 0};
    const roln_scale bad_q = {(roln_real)NAN, scale.t, 1}, bad_t = {scale.q, (roln_real)NAN, 1};
    const roln_scale bad_m = {scale.q, scale.t, (roln_real)NAN};
    const roln_trained with_q = trained(models[k].md, &bad_q, theta_k), with_t = trained(models[k].md, &bad_t, theta_k);
    const roln_trained with_m = trained(models[k].md, &bad_m, theta_k);
    roln_real out[MAXOUT];
    if (uses_q[which]) CHECK(call(which, k, &with_q, in, out) != ROLN_OK);
    if (uses_t[which]) CHECK(call(which, k, &with_t, in, out) != ROLN_OK);
    if (uses_m[which]) CHECK(call(which, k, &with_m, in, out) != ROLN_OK);
}

static void test_calls(int k)
{
    static roln_real in[MAXIN], out[MAXOUT];
    const roln_scale heavy = {scale_of(k)->q, scale_of(k)->t, 4};
    const roln_trained m = trained(models[k].md, &heavy, theta_k);
    uint64_t s = 50 + (uint64_t)k;
    int which, rep;
    units = &heavy;
    parameters(k, &s, theta_k);
    for (which = 0; which < CALLS; which++)
        for (rep = 0; rep < 5; rep++) {
            CHECK(numbers_of(signature_of(which, k).in) <= MAXIN);
            dyadic(MAXIN, 1, &s, in);
            if (which == STEP || which == LINEAR) in[2 * n_OF(k) + F_OF(k)] = dt / 4;
            if (which == ALLOCATE) in[2 * n_OF(k)] = ROLN_C(0.25);
            CHECK_OK(call(which, k, &m, in, out));
            check_units(which, k, in, out);
            check_edges(which, k, in);
            check_scales(which, k, in);
        }
}

/* M zdd + c + g + d = tau_z, zdd from a very short step; power of the force in both worlds. */
static void test_motion(int k)
{
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), inputs = models[k].md->inputs;
    const ld h = powl(2, PICK(-8, -20));
    roln_real z[MAXN], zd[MAXN], z1[MAXN], zd1[MAXN], M[64],
        c[MAXN], g[MAXN], d[MAXN], T = 0, V = 0, in[MAXN], tau_z[MAXN], q[MAXN],
        qd[MAXN];
    const roln_terms_out terms = {M, c, g, d, &T, &V};
    ld zdd[MAXN], top = 0, kinetic = 0, power = 0, power_z = 0, size = 0;
    uint64_t s = 1050 + (uint64_t)k;
    int i, j;
    parameters(k, &s, theta_k);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(N, 1, &s, in);
    memcpy(z1, z, sizeof z), memcpy(zd1, zd, sizeof zd);
    CHECK_OK(roln_terms(&m, z, zd, &terms, ROOM(terms)));
    CHECK_OK(roln_reduce(&m, z, in, tau_z, ROOM(reduce)));
    CHECK_OK(roln_step(&m, z1, zd1, in, (roln_real)h, ROOM(step)));
    CHECK_OK(roln_decode(&m, z, zd, q, qd, ROOM(decode)));
    for (i = 0; i < n; i++) {
        const ld forces = fabsl((ld)tau_z[i]) + fabsl((ld)c[i]) + fabsl((ld)g[i]);
        zdd[i] = ((ld)zd1[i] - (ld)zd[i]) / h;
        top = forces > top ? forces : top;
        power_z += (ld)tau_z[i] * (ld)zd[i];
    }
    for (i = 0; i < n; i++) {
        ld e = (ld)c[i] + (ld)g[i] + (ld)d[i] - (ld)tau_z[i];
        for (j = 0; j < n; j++) {
            e += (ld)M[i * n + j] * zdd[j];
            kinetic += (ld)(zd[i] * M[i * n + j] * zd[j]) / 2;
        }
        BOUND("motion: M zdd + c + g + d = tau_z", fabsl(e) / top / (h + EPS / h), 30);
    }
    CHECK_NEAR((ld)T / kinetic, 1, 20 * EPS);
    for (i = 0; i < N; i++) {
        roln_real tau = inputs ? 0 : in[i]; /* or B u */
        for (j = 0; j < inputs; j++)
            tau += theta_k[models[k].params - N * F + i * F + j] * in[j];
        power += (ld)tau * (ld)qd[i], size += fabsl((ld)tau * (ld)qd[i]);
    }
    CHECK_NEAR(power_z / size, power / size, 20 * EPS);
}

/* No force is a force of 0; and a step that fails gives its status, whatever lies in the scratch. */
static void test_linear_calls(int k)
{
    const roln_trained m = of_model(k);
    const int n = n_OF(k), F = F_OF(k), nn = 4 * n * n, nf = 2 * n * F,
              P = roln_ae_params(&models[k].md->ae) + rolni_base_at(&models[k].md->lnn);
    roln_real none[MAXN] = {0}, s[2 * MAXN], s0[2 * MAXN], A[MAXOUT], A0[MAXOUT], B[MAXOUT], B0[MAXOUT], was[2 * MAXN];
    roln_real *work;
    uint64_t seed = 255 + (uint64_t)k;
    parameters(k, &seed, theta_k);
    dyadic(2 * n, 1, &seed, s);
    memcpy(s0, s, sizeof s), memcpy(was, s, sizeof s);
    CHECK_OK(roln_linear(&m, s, s + n, NULL, dt / 8, A, B, ROOM(linear)));
    CHECK_OK(roln_linear(&m, s0, s0 + n, none, dt / 8, A0, B0, ROOM(linear)));
    CHECK(same(2 * n, s, s0) && same(nn, A, A0) && same(nf, B, B0) && !same(2 * n, s, was));
    if (!models[k].md->lnn.base) return;
    theta_k[P] = -1; /* the base point is not SPD */
    work = ROOM(linear);
    fill(models[k].scratch.linear, ROLN_C(0.5), work);
    memcpy(s, was, sizeof s), fill(MAXOUT, 7, A), fill(MAXOUT, 7, B);
    CHECK(roln_linear(&m, s, s + n, none, dt / 8, A, B, work) == ROLN_E_NOT_SPD);
    CHECK(same(2 * n, s, was) && all(MAXOUT, A, 7) && all(MAXOUT, B, 7));
    CHECK(roln_step(&m, s, s + n, none, dt / 8, ROOM(step)) == ROLN_E_NOT_SPD);
}

/* ---- mechanics -------------------------------------------------------------------------------- */

#ifdef ROLN_DOUBLE
static const double shift[4] = {1, -1, 2, -2};

/* Derivative of what v holds at shifts of h: error h^4 f''''' / 30. */
#define SLOPE(v, i, h) ((8 * ((v)[0][i] - (v)[1][i]) - ((v)[2][i] - (v)[3][i])) / (12 * (h)))

/* zdd of the 3-jet: zd along the parabola q + qd t + qdd t^2 / 2. */
static void test_jet(int k)
{
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    double q[MAXN], qd[MAXN], qdd[MAXN], x[MAXN], xd[MAXN], z[MAXN], zd[MAXN], zdd[MAXN], zs[4][MAXN], zds[4][MAXN], top;
    const double h = 2e-4;
    uint64_t s = 200 + (uint64_t)k;
    int i, j;
    parameters(k, &s, theta_k);
    dyadic(N, 1, &s, q), dyadic(N, 1, &s, qd), dyadic(N, 1, &s, qdd);
    CHECK_OK(roln_encode(&m, q, qd, qdd, z, zd, zdd, ROOM(aim)));
    for (j = 0; j < 4; j++) {
        const double t = shift[j] * h;
        for (i = 0; i < N; i++) {
            x[i] = q[i] + t * qd[i] + t * t / 2 * qdd[i];
            xd[i] = qd[i] + t * qdd[i];
        }
        CHECK_OK(roln_encode(&m, x, xd, NULL, zs[j], zds[j], NULL, ROOM(encode)));
    }
    top = (double)largest(n, zdd);
    for (i = 0; i < n; i++) {
        BOUND("zd of the jet", fabs(SLOPE(zs, i, h) - zd[i]) / top, 1e-9);
        BOUND("zdd of the jet", fabs(SLOPE(zds, i, h) - zdd[i]) / top, 1e-9);
    }
}

/* C(z, zd) w from the Christoffel symbols, dM/dz by differences; c [n] out, and M, g, d. */
static void slow_coriolis(int k, const double *z, const double *zd, const double *w, double *M, double *c, double *g, double *d)
{
    static double v[MAXN][4][64], dM[MAXN][64];
    const roln_trained m = of_model(k);
    const roln_terms_out terms = {M, NULL, g, d, NULL, NULL};
    const double h = 2e-3;
    const int n = n_OF(k);
    double x[MAXN];
    int i, j, l;
    for (l = 0; l < n; l++) {
        for (j = 0; j < 4; j++) {
            const roln_terms_out moved = {v[l][j], NULL, NULL, NULL, NULL, NULL};
            memcpy(x, z, (size_t)n * sizeof *x);
            x[l] += shift[j] * h;
            CHECK_OK(roln_terms(&m, x, zd, &moved, ROOM(terms)));
        }
        for (i = 0; i < n * n; i++)
            dM[l][i] = SLOPE(v[l], i, h);
    }
    CHECK_OK(roln_terms(&m, z, zd, &terms, ROOM(terms)));
    for (i = 0; i < n; i++)
        for (c[i] = 0, j = 0; j < n; j++)
            for (l = 0; l < n; l++)
                c[i] += (dM[l][i * n + j] + dM[j][i * n + l] - dM[i][j * n + l]) * zd[l] * w[j] / 2;
}

/* roln_inverse with a velocity w and with zd, roln_control, against those terms. */
static void test_inverse(int k)
{
    enum { WITH_W, WITH_ZD, PD, WAYS };
    const roln_trained m = of_model(k);
    const int n = n_OF(k);
    double z[MAXN], zd[MAXN], w[MAXN], a[MAXN], kp[MAXN], kd[MAXN], zr[MAXN], M[64], c[MAXN], g[MAXN], d[MAXN], out[MAXN], top = 0;
    const roln_target ref = {zr, w, a, kp, kd, NULL};
    uint64_t s = 210 + (uint64_t)k;
    int i, j, way;
    parameters(k, &s, theta_k);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(n, 1, &s, w), dyadic(n, 1, &s, a);
    dyadic(n, 1, &s, kp), dyadic(n, 1, &s, kd), dyadic(n, 1, &s, zr);
    for (way = 0; way < WAYS; way++) {
        slow_coriolis(k, z, zd, way == WITH_ZD ? zd : w, M, c, g, d);
        if (way == PD) CHECK_OK(roln_control(&m, z, zd, &ref, out, ROOM(control)));
        else CHECK_OK(roln_inverse(&m, z, zd, way == WITH_ZD ? NULL : w, a, out, ROOM(inverse)));
        top = (double)largest(n, out) > top ? (double)largest(n, out) : top;
        for (i = 0; i < n; i++) {
            double e = c[i] + g[i] + d[i];
            for (j = 0; j < n; j++)
                e += M[i * n + j] * a[j];
            if (way == PD) e -= kp[i] * (z[i] - zr[i]) + kd[i] * (zd[i] - w[i]);
            BOUND("inverse dynamics, control", fabs(out[i] - e) / top, 1e-8); /* h^4 of the differences: 1e-10 x their size */
        }
    }
}

/* Energy gained - work of forces + dissipation over 0.4 s in `steps` steps, as a part of the work moved. */
static double power_error(int k, const roln_trained *m, const double *z0, const double *zd0, const double *tau, int steps)
{
    const int n = n_OF(k);
    const double h = 0.4 / steps;
    double z[MAXN], zd[MAXN], tau_z[MAXN], d[MAXN], T = 0, V = 0, gained = 0, work = 0, moved = 0;
    const roln_terms_out terms = {NULL, NULL, NULL, d, &T, &V};
    int p, i;
    memcpy(z, z0, sizeof z), memcpy(zd, zd0, sizeof zd);
    for (p = 0; p <= steps; p++) {
        double power = 0;
        CHECK_OK(roln_terms(m, z, zd, &terms, spare));
        CHECK_OK(roln_reduce(m, z, tau, tau_z, spare));
        for (i = 0; i < n; i++)
            power += zd[i] * (tau_z[i] - d[i]);
        if (p == 0) gained -= T + V;
        if (p == steps) gained += T + V;
        work += h * power * (p == 0 || p == steps ? 1 : p % 2 ? 4 : 2) / 3;
        moved += h * fabs(power);
        if (p < steps) CHECK_OK(roln_step(m, z, zd, tau, h, spare));
    }
    return fabs(gained - work) / moved;
}

/* The error of the balance falls with the fourth power of the step. */
static void test_power(int k)
{
    roln_model md = *models[k].md;
    const roln_trained m = trained(&md, scale_of(k), theta_k);
    double z[MAXN], zd[MAXN], tau[MAXN], e[2];
    uint64_t s = 220 + (uint64_t)k;
    md.scheme = ROLN_RK4;
    parameters(k, &s, theta_k);
    dyadic(n_OF(k), 1, &s, z), dyadic(n_OF(k), 1, &s, zd), dyadic(F_OF(k), 1, &s, tau);
    e[0] = power_error(k, &m, z, zd, tau, 40);
    e[1] = power_error(k, &m, z, zd, tau, 80);
    BOUND("power balance", e[1], 1e-5);
    if (e[1] > 1e-11) BOUND("power balance, halved step: 16 times", fabs(log2(e[0] / e[1]) - 4), 1);
}

/* The n positive eigenvalues of Y [N][N], which has no other but 0. */
static void check_rank(int N, int n, const double *Y)
{
    static ld A[TN * TN], Q[TN * TN];
    int positive = 0, i, j;
    ld big = 0;
    widen(N * N, Y, A);
    for (i = 0; i < N; i++)
        for (j = 0; j < i; j++)
            A[i * N + j] = A[j * N + i];
    t_jacobi(N, A, Q);
    for (i = 0; i < N; i++)
        big = A[i * N + i] > big ? A[i * N + i] : big;
    for (i = 0; i < N; i++) {
        positive += A[i * N + i] > 1e-10L * big;
        CHECK(A[i * N + i] > -100 * EPS * big);
    }
    CHECK(positive == n);
}

/* Apparent inertia: dense D^T M D, symmetric, positive semi-definite of rank n, T. */
static void test_inertia(int k)
{
    static double Y[MAXN * MAXN], D[MAXN * MAXN];
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    double z[MAXN], zd[MAXN], q[MAXN], qd[MAXN], M[64], v[MAXN], y[MAXN], one[MAXN], column[MAXN], T = 0, top = 0, e;
    const roln_terms_out terms = {M, NULL, NULL, NULL, &T, NULL};
    uint64_t s = 230 + (uint64_t)k;
    int i, j, a, b;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd);
    CHECK_OK(roln_decode(&m, z, zd, q, qd, ROOM(decode)));
    CHECK_OK(roln_terms(&m, z, zd, &terms, ROOM(terms)));
    for (j = 0; j < N; j++) {
        fill(MAXN, 0, one), one[j] = 1;
        CHECK_OK(roln_encode(&m, q, one, NULL, y, column, NULL, ROOM(encode)));
        for (a = 0; a < n; a++)
            D[a * N + j] = column[a];
        CHECK_OK(roln_inertia(&m, z, one, one, ROOM(inertia))); /* in place */
        for (i = 0; i < N; i++)
            Y[i * N + j] = one[i];
    }
    top = (double)largest(N * N, Y);
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++) {
            for (e = 0, a = 0; a < n; a++)
                for (b = 0; b < n; b++)
                    e += D[a * N + i] * M[a * n + b] * D[b * N + j];
            BOUND("inertia - D^T M D, eps", fabs(Y[i * N + j] - e) / top / EPS, 1000);
            BOUND("inertia, asymmetry, eps", fabs(Y[i * N + j] - Y[j * N + i]) / top / EPS, 100);
        }
    CHECK_OK(roln_inertia(&m, z, qd, y, ROOM(inertia)));
    for (e = 0, i = 0; i < N; i++)
        e += qd[i] * y[i] / 2;
    BOUND("inertia, 1/2 qd^T y = T, eps", fabs(e / T - 1) / EPS, k == DEEP ? 1e6 : 500);
    check_rank(N, n, Y);
    dyadic(N, 1, &s, v); /* D v = 0: no inertia */
    CHECK_OK(roln_encode(&m, q, v, NULL, column, zd, NULL, ROOM(encode)));
    CHECK_OK(roln_decode(&m, z, zd, q, qd, ROOM(decode)));
    for (i = 0; i < N; i++)
        v[i] -= qd[i];
    CHECK_OK(roln_inertia(&m, z, v, y, ROOM(inertia)));
    for (i = 0; i < N; i++)
        BOUND("inertia off the manifold, eps", fabs(y[i]) / top / EPS, k == DEEP ? 1e5 : 500);
}

/* A and B of a model against differences of roln_step. */
static void check_linear(const roln_model *md, uint64_t *seed)
{
    static double A[MAXOUT], A1[MAXOUT], B[2 * MAXOUT];
    const roln_trained m = trained(md, &scale, theta_k);
    const int n = md->lnn.n, n2 = 2 * n, F = roln_force_size(md);
    double x[64], y[64], z[64], r[4][64], h = 1e-3, top;
    int i, j, p;
    dyadic(n2 + F, 1, seed, x);
    memcpy(z, x, sizeof z), memcpy(y, x, sizeof y);
    CHECK_OK(roln_linear(&m, z, z + n, x + n2, dt / 8, A, B, spare));
    CHECK(roln_step(&m, y, y + n, x + n2, dt / 8, spare) == ROLN_OK && same(n2, y, z)); /* advances like a step */
    memcpy(y, x, sizeof y);
    CHECK(roln_linear(&m, y, y + n, x + n2, dt / 8, A1, NULL, spare) == ROLN_OK && same(n2 * n2, A, A1) && same(n2, y, z));
    top = (double)largest(n2 * n2, A);
    for (j = 0; j < n2 + F; j++) {
        const double was = x[j];
        for (p = 0; p < 4; p++) {
            x[j] = was + shift[p] * h;
            memcpy(r[p], x, sizeof x);
            CHECK_OK(roln_step(&m, r[p], r[p] + n, x + n2, dt / 8, spare));
        }
        x[j] = was;
        for (i = 0; i < n2; i++)
            BOUND("linearisation", fabs(SLOPE(r, i, h) - (j < n2 ? A[i * n2 + j] : B[i * F + j - n2])) / top, 1e-8);
    }
    CHECK(largest(n2 * F, B) > 0);
}

/* Every integrator, tau and u. */
static void test_linear(int k)
{
    uint64_t s = 250 + (uint64_t)k;
    int scheme;
    parameters(k, &s, theta_k);
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++) {
        roln_model m = driven(k, scheme);
        check_linear(&m, &s);
        m.inputs = models[k].md->inputs;
        if (m.inputs > 0) check_linear(&m, &s);
    }
}

/* Closed loop on the model itself, at s and time t: W = 1/2 ed^T M ed + 1/2 e^T Kp e; *rate = -ed^T Kd ed, sd [2n] the motion. */
static double lyapunov(int k, const double *s, double t, const double *kp, const double *kd, double *rate, double *sd)
{
    const roln_trained m = of_model(k);
    const int n = n_OF(k);
    double r[MAXN], rd[MAXN], rdd[MAXN], M[64], c[MAXN], g[MAXN], d[MAXN], tau_z[MAXN], x[MAXN], W = 0;
    const roln_terms_out terms = {M, c, g, d, NULL, NULL};
    const roln_target ref = {r, rd, rdd, kp, kd, NULL};
    int i, j;
    for (i = 0; i < n; i++) {
        r[i] = 0.3 * sin(t + i);
        rd[i] = 0.3 * cos(t + i);
        rdd[i] = -0.3 * sin(t + i);
    }
    CHECK_OK(roln_control(&m, s, s + n, &ref, tau_z, ROOM(control)));
    CHECK_OK(roln_terms(&m, s, s + n, &terms, ROOM(terms)));
    for (*rate = 0, i = 0; i < n; i++) {
        double p = 0;
        for (j = 0; j < n; j++)
            p += M[i * n + j] * (s[n + j] - rd[j]);
        W += (s[n + i] - rd[i]) * p / 2 + kp[i] * (s[i] - r[i]) * (s[i] - r[i]) / 2;
        *rate -= kd[i] * (s[n + i] - rd[i]) * (s[n + i] - rd[i]);
        x[i] = tau_z[i] - c[i] - g[i] - d[i];
    }
    CHECK_OK(roln_chol(n, M, M));
    roln_solve_lower(n, M, x, x), roln_solve_lower_t(n, M, x, sd + n);
    memcpy(sd, s + n, (size_t)n * sizeof *s);
    return W;
}

/* W falls at the rate ed^T Kd ed, and e -> 0. */
static void test_closed_loop(int k)
{
    enum { STEPS = 2000, FIRST = 600 };
    static double W[STEPS], rate[STEPS];
    const int n = n_OF(k);
    const double h = 0.005;
    double s[2 * MAXN], x[2 * MAXN], K[4][2 * MAXN], kp[MAXN], kd[MAXN], scrap, top = 0;
    uint64_t seed = 260 + (uint64_t)k;
    int step, i, p;
    parameters(k, &seed, theta_k);
    dyadic(2 * n, ROLN_C(0.5), &seed, s);
    for (i = 0; i < n; i++)
        kp[i] = 8 + i, kd[i] = 6 + i;
    for (step = 0; step < STEPS; step++) {
        const double t = step * h;
        W[step] = lyapunov(k, s, t, kp, kd, rate + step, K[0]);
        if (step > 0) CHECK(W[step] <= W[step - 1] + 1e-10 * W[0]);
        if (step < FIRST) top = fabs(rate[step]) > top ? fabs(rate[step]) : top;
        if (step > 1 && step < FIRST) { /* Simpson over two steps: h^4 */
            const double fell = (W[step] - W[step - 2]) / (2 * h), mean = (rate[step - 2] + 4 * rate[step - 1] + rate[step]) / 6;
            BOUND("dW/dt = - ed^T Kd ed", fabs(fell - mean) / top, 1e-5);
        }
        for (p = 1; p < 4; p++) { /* rk4 */
            const double a = p == 3 ? h : h / 2;
            for (i = 0; i < 2 * n; i++)
                x[i] = s[i] + a * K[p - 1][i];
            lyapunov(k, x, t + a, kp, kd, &scrap, K[p]);
        }
        for (i = 0; i < 2 * n; i++)
            s[i] += h / 6 * (K[0][i] + 2 * K[1][i] + 2 * K[2][i] + K[3][i]);
    }
    BOUND("closed loop, W after 10 s", W[STEPS - 1] / W[0], 1e-4);
}
#endif

/* J^T (D^T tau_z) = tau_z where the autoencoder is true. */
static void test_lift(int k)
{
    const roln_model md = driven(k, ROLN_RK4);
    const roln_trained m = trained(&md, scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real z[MAXN], tau_z[MAXN], tau[MAXN], back[MAXN];
    uint64_t s = 280 + (uint64_t)k;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, tau_z);
    CHECK_OK(roln_lift(&m, z, tau_z, tau, ROOM(lift)));
    CHECK_OK(roln_reduce(&m, z, tau, back, spare));
    BOUND("reduce(lift), eps", furthest(n, back, tau_z) / EPS, k == DEEP ? 1e7L : 200); /* eight layers: D, J of size 1e3 */
}

/* Motors for a model, G = J^T B by columns as far as it is known, and the largest number of G. */
typedef struct {
    int motors;
    roln_real z[MAXN], tau_z[MAXN], B[MAXN * 8], top;
    ld G[MAXN * 8];
} drive;

/* G and top, of z and B. */
static void reduce_motors(int k, const roln_trained *m, drive *x)
{
    const int N = N_OF(k), n = n_OF(k), motors = x->motors;
    roln_real column[MAXN], g[MAXN];
    int i, j;
    x->top = 0;
    for (j = 0; j < motors; j++) {
        for (i = 0; i < N; i++)
            column[i] = x->B[i * motors + j];
        CHECK_OK(roln_reduce(m, x->z, column, g, spare));
        for (i = 0; i < n; i++) {
            x->G[i * motors + j] = (ld)g[i];
            x->top = ROLN_ABS(g[i]) > x->top ? ROLN_ABS(g[i]) : x->top;
        }
    }
}

static void place_motors(int k, const roln_trained *m, int motors, uint64_t *s, drive *x)
{
    x->motors = motors;
    valid(k, s);
    dyadic(n_OF(k), 1, s, x->z), dyadic(n_OF(k), 1, s, x->tau_z), dyadic(N_OF(k) * motors, 1, s, x->B);
    reduce_motors(k, m, x);
}

/* (G^T G + mu^2 I) u = G^T tau_z */
static void check_damped(int n, const drive *x, roln_real mu, const roln_real *u)
{
    static ld A[TN * TN], b[TN];
    const int motors = x->motors;
    ld top = 0;
    int i, j, p;
    for (j = 0; j < motors; j++) {
        for (b[j] = 0, i = 0; i < n; i++)
            b[j] += x->G[i * motors + j] * (ld)x->tau_z[i];
        for (p = 0; p < motors; p++) {
            A[j * motors + p] = j == p ? (ld)mu * (ld)mu : 0;
            for (i = 0; i < n; i++)
                A[j * motors + p] += x->G[i * motors + j] * x->G[i * motors + p];
        }
    }
    t_solve(motors, 1, A, b);
    for (j = 0; j < motors; j++)
        top = fabsl(b[j]) > top ? fabsl(b[j]) : top;
    for (j = 0; j < motors; j++) /* condition up to |G|^2 / mu^2 = 64 n motors */
        BOUND("allocation, eps", fabsl((ld)u[j] - b[j]) / (top + 1e-3L * (ld)mu) / EPS, 5000);
}

/* What u does not make of tau_z, as a part of it. */
static void check_missed(int n, const drive *x, const roln_real *u, roln_real missed)
{
    ld most = 0, lost = 0, rest, size = 0;
    int i, j;
    for (i = 0; i < n; i++) {
        rest = (ld)x->tau_z[i];
        for (j = 0; j < x->motors; j++)
            rest -= x->G[i * x->motors + j] * (ld)u[j], size = ROLN_MAX(size, fabsl(x->G[i * x->motors + j] * (ld)u[j]));
        most += (ld)x->tau_z[i] * (ld)x->tau_z[i], lost += rest * rest;
    }
    BOUND("allocation, what is missed, eps", fabsl((ld)missed - sqrtl(lost / most)) / (1 + size / sqrtl(most)) / EPS, 200);
}

/* As many motors as z has: exact as mu -> 0. */
static void check_square(int n, const drive *x, roln_real mu, const roln_real *u)
{
    static ld A[TN * TN], b[TN];
    ld top = 0;
    int i;
    memcpy(A, x->G, (size_t)(n * n) * sizeof *A);
    for (i = 0; i < n; i++)
        b[i] = (ld)x->tau_z[i];
    t_solve(n, 1, A, b);
    for (i = 0; i < n; i++)
        top = fabsl(b[i]) > top ? fabsl(b[i]) : top;
    if (top * (ld)mu > 0.25L) return; /* badly placed motors: damped, or lost in rounding */
    for (i = 0; i < n; i++)
        CHECK_NEAR(u[i], b[i], PICK(2e-2L, 1e-9L) * top);
}

/* Of a model with inputs, no motors are those that it has learned, undamped. */
static void check_learned_inputs(int k, const roln_real *z, const roln_real *tau_z)
{
    static const roln_motors learned = {0, NULL, 0};
    const roln_trained m = of_model(k);
    const int inputs = m.model->inputs;
    roln_real u[MAXN], same_u[MAXN], lost = 7, same_lost = 7;
    if (inputs == 0) return;
    fill(MAXN, 7, u), fill(MAXN, 7, same_u);
    CHECK(roln_allocate(&m, z, NULL, tau_z, u, &lost, spare) == roln_allocate(&m, z, &learned, tau_z, same_u, &same_lost, spare));
    CHECK(same(MAXN, u, same_u) && same(1, &lost, &same_lost));
}

/* As many motors as z has, undamped: two of them nearly parallel, or one in units of its own. What they are given makes tau_z, or
   they are refused; down to a thousandth apart as float, and in any unit to 10^-4, they are not. */
static void test_near_motors(int k)
{
    static drive x;
    const roln_model md = driven(k, ROLN_RK4);
    const roln_trained m = trained(&md, scale_of(k), theta_k);
    const int N = N_OF(k), n = n_OF(k);
    const roln_motors f = {n, x.B, 0};
    roln_real u[8];
    uint64_t s = 290 + (uint64_t)k;
    int round, kind, i, e;
    for (round = 0; round < 40 && n > 1 && n <= 8; round++)
        for (kind = 0; kind < 2; kind++)
            for (e = 1; e <= 5; e++) {
                static ld A[TN * TN], b[TN];
                const roln_real by = (roln_real)pow(10, -e);
                ld top = 0, size = 0, off = 0;
                roln_status st;
                place_motors(k, &m, n, &s, &x);
                for (i = 0; i < N; i++)
                    x.B[i * n + 1] = (kind == 0 ? x.B[i * n] : 0) + by * x.B[i * n + 1];
                reduce_motors(k, &m, &x);
                fill(8, 7, u);
                st = roln_allocate(&m, x.z, &f, x.tau_z, u, NULL, ROOM(allocate));
                ROOM_KEPT();
                memcpy(A, x.G, (size_t)(n * n) * sizeof *A), widen(n, x.tau_z, b);
                t_solve(n, 1, A, b);
                for (i = 0; i < n; i++)
                    top = ROLN_MAX(top, fabsl(b[i]) * (i == 1 && kind == 1 ? (ld)by : 1)),
                    size = ROLN_MAX(size, fabsl((ld)x.tau_z[i]));
                if (top * (ld)x.top > 30 * size / (kind == 0 ? (ld)by : 1)) continue; /* by chance others are nearly so, too */
                if (st != ROLN_OK) {
                    CHECK(e > PICK(3, 5) - (kind == 0) && all(8, u, 7));
                    continue;
                }
                for (i = 0; i < n; i++) {
                    ld rest = (ld)x.tau_z[i];
                    int j;
                    for (j = 0; j < n; j++)
                        rest -= x.G[i * n + j] * (ld)u[j];
                    off = ROLN_MAX(off, fabsl(rest));
                }
                BOUND(kind ? "motors of other units: what is missed" : "motors nearly parallel: what is missed", off / size,
                      PICK(0.011L, 1e-7L));
            }
}

/* Damped least squares. */
static void test_allocate(int k)
{
    static drive x;
    const roln_model md = driven(k, ROLN_RK4);
    const roln_trained m = trained(&md, scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real u[8], lost = 0;
    uint64_t s = 280 + (uint64_t)k;
    int motors, i, round, wild = 0, missed = 0, tried = 0;
    roln_motors f = {0, x.B, 0};
    for (motors = 1; motors <= 6; motors++)
        for (round = 0; round < 20; round++) {
            roln_real mu;
            place_motors(k, &m, motors, &s, &x);
            mu = x.top / 8, f.count = motors, f.mu = mu;
            CHECK_OK(roln_allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)));
            ROOM_KEPT();
            check_damped(n, &x, mu, u);
            check_missed(n, &x, u, lost);
            if (motors == n) {
                f.mu = mu * PICK(1e-2f, 1e-7);
                if (roln_allocate(&m, x.z, &f, x.tau_z, u, NULL, ROOM(allocate)) == ROLN_OK) check_square(n, &x, mu, u);
            }
            if (motors < n) { /* mu = 0 and too few motors: refused and u untouched, or where rounding hides it no wild torque */
                int taken;
                fill(8, 7, u);
                lost = 7, f.mu = 0;
                taken = roln_allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK;
                wild += !taken && !all(1, &lost, 7);
                for (i = 0; i < motors && taken; i++)
                    wild += !(ROLN_ABS(u[i]) * x.top < 100);
                wild += !all(taken ? 8 - motors : 8, u + (taken ? motors : 0), 7);
                missed += taken, tried++;
            }
        }
    CHECK_BELOW(wild, 0);
    CHECK_BELOW(missed, tried / 20);
    for (motors = -1; motors < 1; motors++) {
        fill(8, 7, u);
        lost = 7, f.count = motors;
        CHECK(roln_allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_E_LENGTH && all(8, u, 7) && all(1, &lost, 7));
    }
    CHECK(roln_allocate(&m, x.z, NULL, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_E_LENGTH); /* it has learned no inputs */
    check_learned_inputs(k, x.z, x.tau_z);
    place_motors(k, &m, n, &s, &x);
    f.count = n, f.mu = 1;
    fill(n, 0, x.tau_z);
    CHECK(roln_allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK && all(n, u, 0) && all(1, &lost, 0));
    { /* motors so weak that their share is no number, undamped: none of it is missed */
        const roln_real little = PICK(1e-30f, 1e-200), much = PICK(1e30f, 1e200);
        CHECK(rolni_missed(1, &little, &much, 0) <= 0);
    }
    x.tau_z[0] = PICK(1e-30f, 1e-250), f.mu = PICK(1e15f, 1e100); /* damped to 0: all of it is missed */
    CHECK(roln_allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK && all(n, u, 0) && all(1, &lost, 1));
}

/* kp = diag(J^T Kp J), J by columns from the velocity that unit zd decodes to. */
static void test_gains(int k)
{
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[MAXN], K[2 * MAXN], kp[MAXN], kd[MAXN], zd[MAXN], q[MAXN], J[MAXN], *of[2] = {z, K};
    uint64_t s = 290 + (uint64_t)k;
    int i, j;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(2 * N, 1, &s, K);
    CHECK_OK(roln_gains(&m, z, K, K + N, kp, kd, ROOM(gains)));
    ROOM_KEPT();
    for (j = 0; j < n; j++) {
        ld p = 0, d = 0, size = 0;
        fill(n, 0, zd), zd[j] = 1;
        CHECK_OK(roln_decode(&m, z, zd, q, J, spare));
        for (i = 0; i < N; i++) {
            p += (ld)K[i] * (ld)J[i] * (ld)J[i], d += (ld)K[N + i] * (ld)J[i] * (ld)J[i];
            size += (ld)J[i] * (ld)J[i];
        }
        BOUND("gains, eps", (fabsl((ld)kp[j] - p) + fabsl((ld)kd[j] - d)) / size / EPS, 10);
    }
    for (i = 0; i < 2; i++) {
        of[i][0] = (roln_real)NAN;
        fill(n, 7, kp), fill(n, 7, kd);
        CHECK(roln_gains(&m, z, K, K + N, kp, kd, ROOM(gains)) == ROLN_E_NOT_FINITE && all(n, kp, 7) && all(n, kd, 7));
        of[i][0] = 0;
    }
}

/* ---- feedback of least cost ------------------------------------------------------------------- */

/* What roln_lqr is asked, and what it gives. */
typedef struct {
    roln_real s[2 * MAXN], u[MAXN], q[MAXN], qd[MAXN], r[MAXN], B[MAXN * MAXN], K[2 * MAXN * MAXN], P[4 * MAXN * MAXN];
    roln_motors motors;
    roln_cost cost;
    int count; /* numbers of u */
} feedback;

/* A pose; two motors, or one at each joint; dear motors keep what is very unstable within the digits. */
static void place_feedback(int k, int two, uint64_t *s, feedback *x)
{
    const int N = N_OF(k), n = n_OF(k);
    int i;
    memset(x, 0, sizeof *x);
    valid(k, s);
    dyadic(n, ROLN_C(0.5), s, x->s), dyadic(N * 2, 1, s, x->B), dyadic(N, ROLN_C(0.125), s, x->u);
    dyadic(N, ROLN_C(0.25), s, x->q), dyadic(N, ROLN_C(0.25), s, x->qd);
    for (i = 0; i < N; i++)
        x->q[i] += 1, x->qd[i] += ROLN_C(0.5), x->r[i] = ROLN_C(0.125) * (roln_real)(1 + i % 2);
    x->motors.count = 2, x->motors.B = x->B;
    x->cost.q = x->q, x->cost.qd = x->qd, x->cost.u = x->r, x->cost.dt = dt, x->cost.motors = two ? &x->motors : NULL;
    x->count = two ? 2 : F_OF(k);
}

/* A, B of the step, and Q = diag(J^T q J, J^T qd J), from NAME_linear and NAME_decode. */
static void feedback_twin(int k, const roln_trained *m, const feedback *x, ld *A, ld *B, ld *Q)
{
    static roln_real a[4 * MAXN * MAXN], b[2 * MAXN * MAXN], J[MAXN * MAXN];
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), two = x->cost.motors != NULL;
    roln_real s[2 * MAXN], tau[MAXN], unit_zd[MAXN], q[MAXN];
    int i, j, p;
    memcpy(s, x->s, sizeof s), memcpy(tau, x->u, sizeof tau);
    for (i = 0; i < N && two; i++)
        tau[i] = x->B[2 * i] * x->u[0] + x->B[2 * i + 1] * x->u[1];
    for (i = 0; i < n && models[k].md->lnn.friction; i++) { /* where it has no slope any more */
        roln_real c[MAXN], v[MAXN];
        roln_friction(m, c, v);
        s[n + i] += s[n + i] < 0 ? -4 * v[i] : 4 * v[i];
    }
    CHECK_OK(roln_linear(m, s, s + n, tau, dt, a, b, spare));
    widen(4 * n * n, a, A);
    for (i = 0; i < 2 * n; i++)
        for (j = 0; j < x->count; j++)
            for (B[i * x->count + j] = two ? 0 : (ld)b[i * F + j], p = 0; p < N && two; p++)
                B[i * x->count + j] += (ld)b[i * F + p] * (ld)x->B[2 * p + j];
    for (j = 0; j < n; j++) {
        fill(n, 0, unit_zd), unit_zd[j] = 1;
        CHECK_OK(roln_decode(m, x->s, unit_zd, q, J + j * N, spare));
    }
    for (i = 0; i < 4 * n * n; i++)
        Q[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (p = 0; p < N; p++) {
                const ld JJ = (ld)J[i * N + p] * (ld)J[j * N + p];
                Q[i * 2 * n + j] += JJ * (ld)x->q[p], Q[(n + i) * 2 * n + n + j] += JJ * (ld)x->qd[p];
            }
}

/* P and K solve P = Q + A^T P (A - B K), (R + B^T P B) K = B^T P A, to rounding; P is symmetric to the bit. */
static void check_feedback(int k, const feedback *x, const ld *A, const ld *B, const ld *Q)
{
    static ld PA[4 * MAXN * MAXN], PB[2 * MAXN * MAXN];
    const int w = 2 * n_OF(k), c = x->count;
    ld top = 0, lost = 0, size = 0;
    int i, j, p, l;
    for (i = 0; i < w; i++) {
        for (j = 0; j < w; j++)
            for (PA[i * w + j] = 0, p = 0; p < w; p++)
                PA[i * w + j] += (ld)x->P[i * w + p] * A[p * w + j];
        for (j = 0; j < c; j++)
            for (PB[i * c + j] = 0, p = 0; p < w; p++)
                PB[i * c + j] += (ld)x->P[i * w + p] * B[p * c + j];
    }
    for (i = 0; i < w; i++)
        for (j = 0; j < w; j++) {
            ld rest = Q[i * w + j] - (ld)x->P[i * w + j];
            CHECK(same(1, x->P + i * w + j, x->P + j * w + i));
            for (p = 0; p < w; p++) {
                ld a = A[p * w + j], sum = fabsl(a);
                for (l = 0; l < c; l++)
                    a -= B[p * c + l] * (ld)x->K[l * w + j], sum += fabsl(B[p * c + l] * (ld)x->K[l * w + j]);
                rest += PA[p * w + i] * a, size += fabsl(PA[p * w + i]) * sum;
            }
            lost = fabsl(rest) > lost ? fabsl(rest) : lost;
        }
    BOUND("feedback, equation of P, eps", lost / (1 + size) / EPS, 4);
    for (i = 0; i < c; i++)
        for (j = 0; j < w; j++) {
            ld rest = (ld)x->r[i] * (ld)x->K[i * w + j];
            for (top = fabsl(rest), p = 0; p < w; p++) {
                ld a = A[p * w + j];
                for (l = 0; l < c; l++)
                    a -= B[p * c + l] * (ld)x->K[l * w + j], top += fabsl(PB[p * c + i] * B[p * c + l] * (ld)x->K[l * w + j]);
                rest -= PB[p * c + i] * a, top += fabsl(PB[p * c + i] * A[p * w + j]);
            }
            BOUND("feedback, equation of K, eps", fabsl(rest) / (top + 1e-9L * size) / EPS, 3000);
        }
}

/* Along a reference that stays where it is, a cost P at its end leaves the gains what they are; without P they come to them. */
static void check_along(int k, const roln_trained *m, const feedback *x)
{
    enum { STEPS = 3, LONG = 4000 };
    static roln_real s[(LONG + 1) * 2 * MAXN], u[LONG * MAXN], K[LONG * 2 * MAXN * MAXN];
    const int w = 2 * n_OF(k), c = x->count;
    const ld top = largest(c * w, x->K);
    int i;
    for (i = 0; i <= LONG; i++) {
        memcpy(s + i * w, x->s, (size_t)w * sizeof *s);
        if (i < LONG) memcpy(u + i * c, x->u, (size_t)c * sizeof *u);
    }
    CHECK_OK(roln_lqr_along(m, &x->cost, STEPS, s, u, x->P, K, ROOM(lqr_along)));
    ROOM_KEPT();
    for (i = 0; i < STEPS; i++)
        BOUND("gains along, cost at the end", furthest(c * w, K + i * c * w, x->K) / top, PICK(5e-3L, 1e-8L));
    fill(LONG * c * w, 7, K);
    CHECK_OK(roln_lqr_along(m, &x->cost, LONG, s, u, NULL, K, spare));
    CHECK_BELOW(furthest(c * w, K, x->K), furthest(c * w, K + (LONG - 1) * c * w, x->K) / 4);
}

/* Wrong numbers: a status, and what was there. */
static void check_feedback_refused(int k, const roln_trained *m, const feedback *good)
{
    static feedback x;
    static roln_real along[4 * MAXN];
    const roln_real nan = (roln_real)NAN;
    int what, st, kept;
    for (what = 0; what < 14; what++) {
        roln_status want = ROLN_E_NOT_FINITE;
        x = *good;
        x.cost.q = x.q, x.cost.qd = x.qd, x.cost.u = x.r, x.motors.B = x.B;
        if (good->cost.motors) x.cost.motors = &x.motors;
        fill(2 * MAXN * MAXN, 7, x.K);
        if (what == 0) x.s[0] = nan;
        if (what == 1) x.u[0] = nan;
        if (what == 2) x.q[N_OF(k) - 1] = nan;
        if (what == 3) x.qd[0] = (roln_real)INFINITY;
        if (what == 4) x.r[1 % x.count] = nan;
        if (what == 5) x.q[0] = -1, want = ROLN_E_NOT_SPD;
        if (what == 6) x.qd[N_OF(k) - 1] = -1, want = ROLN_E_NOT_SPD;
        if (what == 7) x.r[0] = 0, want = ROLN_E_NOT_SPD;
        if (what == 8) x.cost.dt = nan, want = ROLN_E_RANGE;
        if (what == 12) x.cost.dt = -dt, want = ROLN_E_RANGE;
        if (what == 13) x.cost.dt = 0, want = ROLN_E_RANGE;
        if (what == 9) x.motors.count = 0, want = ROLN_E_LENGTH;
        if (what == 10) x.motors.count = N_OF(k) + 1, want = ROLN_E_LENGTH;
        if (what == 11) x.P[0] = -1000, want = ROLN_E_NOT_SPD;
        if ((what == 9 || what == 10) && !good->cost.motors) continue;
        memcpy(along, x.s, sizeof x.s), memcpy(along + 2 * n_OF(k), good->s, sizeof x.s);
        if (what != 11) {
            st = roln_lqr(m, &x.cost, x.s, x.u, x.K, x.P, spare);
            kept = all(2 * MAXN * MAXN, x.K, 7) && same(4 * MAXN * MAXN, x.P, good->P);
            if (!CHECK(st != ROLN_OK && kept && (what < 4 || st == (int)want)))
                printf("    %s, wrong number %d: status %d\n", models[k].name, what, st);
        }
        st = roln_lqr_along(m, &x.cost, 1, along, x.u, x.P, x.K, spare);
        if (!CHECK(st != ROLN_OK && all(2 * MAXN * MAXN, x.K, 7))) printf("    %s, along, wrong number %d\n", models[k].name, what);
    }
    CHECK(roln_lqr_along(m, &good->cost, 0, good->s, good->u, NULL, x.K, spare) == ROLN_E_LENGTH);
}

#ifndef ROLN_DOUBLE
/* Row by row, |E - K| as a part of the row; states in units in which they cost alike, P_ii = 1. */
static ld lost_of_rows(int w, int motors, const roln_real *P, const roln_real *K, const roln_real *E)
{
    ld worst = 0;
    int i, j;
    for (j = 0; j < motors; j++) {
        ld off = 0, most = 0;
        for (i = 0; i < w; i++) {
            const ld one = sqrtl((ld)P[i * (w + 1)]), k = fabsl((ld)K[j * w + i]) / one;
            const ld e = fabsl((ld)E[j * w + i] - (ld)K[j * w + i]) / one;
            off = e > off ? e : off, most = k > most ? k : most;
        }
        worst = off / most > worst ? off / most : worst;
    }
    return worst;
}

/* The examples: deviations of joints and of motors over four decades, rising, falling and mixed. A step of NAME_lqr_along from
   the P of NAME_lqr gives its K again, row by row, with light states beside heavy ones: of the arm to 1e-4; of the pendulum, whose
   one motor leaves P with few digits, to what moves of P by eps do. */
static void test_light_states(void)
{
    static arm_lqrwork work;
    static arm_work one;
    static furuta_lqrwork furuta_room;
    static const roln_real first[2] = {1, 0};
    static const roln_motors motor = {1, first, 0};
    const furuta_latent up[2] = {{{0, ROLN_C(3.14159265)}, {0, 0}}, {{0, ROLN_C(3.14159265)}, {0, 0}}};
    arm_latent s[2];
    roln_real q[6], qd[6], r[6], tau_z[6], u[6], K[72], E[72], P[144], M[16];
    ld lost, wide;
    const roln_real still[6] = {0, 0, 0, 0, 0, 0};
    const roln_cost cost = {q, qd, r, ROLN_C(0.005), NULL}, by_one = {q, qd, r, ROLN_C(0.01), &motor};
    uint64_t seed = 19;
    int round, move, i;
    memset(s, 0, sizeof s);
    for (i = 0; i < 6; i++)
        s[0].z[i] = s[1].z[i] = (arm_weights.z_min[i] + arm_weights.z_max[i]) / 2;
    CHECK_OK(arm_inverse(&arm_weights, s, NULL, still, tau_z, &one));
    CHECK_OK(arm_lift(&arm_weights, s, tau_z, u, &one));
    for (round = 0; round < 40; round++) {
        for (i = 0; i < 6; i++) {
            const double share = round == 0 ? i / 5.0 : round == 1 ? 1 - i / 5.0 : (double)roln_uniform(&seed);
            q[i] = (roln_real)pow(10, 8 * share), qd[i] = round % 3 ? 0 : q[i] / 1000;
            r[i] = (roln_real)pow(10, round < 20 ? 0 : 4 * (double)roln_uniform(&seed) - 2);
        }
        if (CHECK_OK(arm_lqr(&arm_weights, &cost, s, u, K, P, &work))) {
            CHECK_OK(arm_lqr_along(&arm_weights, &cost, 1, s, u, P, E, &work));
            BOUND("arm, light states", lost_of_rows(12, 6, P, K, E), 1e-4L);
        }
        r[0] *= 10000; /* the motor's deviation is 0.01 Nm */
        if (CHECK_OK(furuta_lqr(&furuta_weights, &by_one, up, NULL, K, P, &furuta_room))) {
            CHECK_OK(furuta_lqr_along(&furuta_weights, &by_one, 1, up, NULL, P, E, &furuta_room));
            lost = lost_of_rows(4, 1, P, K, E), wide = EPS;
            for (move = 0; move < 8; move++) {
                for (i = 0; i < 16; i++)
                    M[i] = i % 4 > i / 4 ? P[i] : P[i] * (1 + ROLN_EPS * (2 * roln_uniform(&seed) - 1));
                for (i = 0; i < 16; i++)
                    M[i] = i % 4 > i / 4 ? M[i % 4 * 4 + i / 4] : M[i];
                CHECK_OK(furuta_lqr_along(&furuta_weights, &by_one, 1, up, NULL, M, E, &furuta_room));
                wide = lost_of_rows(4, 1, P, K, E) > wide ? lost_of_rows(4, 1, P, K, E) : wide;
            }
            BOUND("furuta, light states", lost, 0.01L);
            BOUND("furuta, light states, in moves of P", lost / wide, 3);
        }
    }
}
#endif

/* Is P a weight? The same answer in all units of states, over six decades, of positive and of singular ones; and each number that
   makes a light part of it none. */
static void test_weights_of_ends(void)
{
    enum { n = 6 };
    uint64_t s = 23;
    int round, rank, i, j;
    for (round = 0; round < 400; round++) {
        roln_real C[n * n], P[n * n], L[n * n], t[n], was;
        rank = round % (n + 1);
        for (i = 0; i < n; i++)
            t[i] = round % 2 ? (roln_real)pow(10, 6 * (double)roln_uniform(&s) - 3) : 1;
        for (i = 0; i < n * n; i++)
            C[i] = i / n < rank && i % n != 4 ? roln_normal(&s) * t[i % n] : 0;
        fill(n * n, 0, P);
        roln_mm_at(n, n, n, C, C, P);
        CHECK_OK(rolni_goal_weighs(n, P, L)); /* state 4 is without cost */
        i = round % 4, j = i + 1 + round % (n - 1 - i), j = j == 4 ? 5 : j;
        if (rank == 0) continue;
        was = P[i * n + j], P[i * n + j] += ROLN_SQRT(P[i * (n + 1)]) * ROLN_SQRT(P[j * (n + 1)]) / 1000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD); /* not symmetric */
        P[i * n + j] = P[j * n + i] = ROLN_SQRT(P[i * (n + 1)]) * ROLN_SQRT(P[j * (n + 1)]) * ROLN_C(1.001);
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[i * n + j] = P[j * n + i] = was;
        was = P[i * (n + 1)], P[i * (n + 1)] = -was / 1000000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[i * (n + 1)] = was;
        P[4 * n + i] = P[i * n + 4] = ROLN_SQRT(was) / 1000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[4 * n + i] = P[i * n + 4] = 0, P[0] = (roln_real)NAN;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_FINITE);
    }
}

/* The midpoint rule may find a step too long. */
static int can_step(const roln_trained *m, const feedback *x)
{
    roln_real s[2 * MAXN];
    memcpy(s, x->s, sizeof s);
    return roln_step(m, s, s + m->model->lnn.n, x->u, dt, spare) == ROLN_OK;
}

static void test_lqr(int k, int two)
{
    static feedback x;
    static ld A[4 * MAXN * MAXN], B[2 * MAXN * MAXN], Q[4 * MAXN * MAXN];
    const roln_trained m = of_model(k);
    uint64_t s = 340 + (uint64_t)k;
    int round;
    if (two && (models[k].md->inputs > 0 || N_OF(k) < 2)) return;
    for (round = 0; round < 4; round++) {
        roln_status st;
        place_feedback(k, two, &s, &x);
        st = roln_lqr(&m, &x.cost, x.s, x.u, x.K, x.P, ROOM(lqr));
        ROOM_KEPT();
        if (k == PUSHED && st == ROLN_E_NO_CONVERGENCE && !can_step(&m, &x)) continue;
        if (k == DEEP && PICK(1, 0) > 0 && st == ROLN_E_NO_CONVERGENCE) continue; /* J of size 1e3, beyond the digits of float */
        if (!CHECK_OK(st)) {
            printf("    %s, two motors %d: status %d\n", models[k].name, two, st);
            continue;
        }
        feedback_twin(k, &m, &x, A, B, Q);
        check_feedback(k, &x, A, B, Q);
        if (round == 0) check_along(k, &m, &x);
        if (round == 1) check_feedback_refused(k, &m, &x);
    }
}

/* ---- guard ------------------------------------------------------------------------------------ */

static uint64_t noise; /* seed of the random patterns */

/* Bit patterns of every class; at >= PATTERNS - 8 they are random. */
enum { PATTERNS = 40 };
static roln_real pattern(int at)
{
#ifdef ROLN_DOUBLE
    static const uint64_t bits[PATTERNS - 8] = {0x0000000000000000u, 0x8000000000000000u, 0x0000000000000001u, 0x8000000000000001u,
                                                0x000fffffffffffffu, 0x800fffffffffffffu, 0x0010000000000000u, 0x8010000000000000u,
                                                0x3ff0000000000000u, 0xbff0000000000000u, 0x7fefffffffffffffu, 0xffefffffffffffffu,
                                                0x7ff0000000000000u, 0xfff0000000000000u, 0x7ff8000000000000u, 0xfff8000000000000u,
                                                0x7ff0000000000001u, 0xfff0000000000001u, 0x7ff7ffffffffffffu, 0xffffffffffffffffu,
                                                0x7fffffffffffffffu, 0x7ff80000deadbeefu, 0x7ff4000000000000u, 0x3cb0000000000000u,
                                                0xbcb0000000000000u, 0x7fe0000000000000u, 0x5fe6a09e667f3bccu, 0xdfe6a09e667f3bccu,
                                                0x1ff0000000000000u, 0x4024000000000000u, 0xc024000000000000u, 0x40590000deadbeefu};
    uint64_t b;
#else
    static const uint32_t bits[PATTERNS - 8] = {0x00000000u, 0x80000000u, 0x00000001u, 0x80000001u, 0x007fffffu, 0x807fffffu,
                                                0x00800000u, 0x80800000u, 0x3f800000u, 0xbf800000u, 0x7f7fffffu, 0xff7fffffu,
                                                0x7f800000u, 0xff800000u, 0x7fc00000u, 0xffc00000u, 0x7f800001u, 0xff800001u,
                                                0x7fbfffffu, 0xffffffffu, 0x7fffffffu, 0x7fc0beefu, 0x7fa00000u, 0x34000000u,
                                                0xb4000000u, 0x7f000000u, 0x5f3504f3u, 0xdf3504f3u, 0x1f800000u, 0x41200000u,
                                                0xc1200000u, 0x42c8beefu};
    uint32_t b;
#endif
    const uint64_t r = roln_rand(&noise);
    roln_real x;
    memcpy(&b, at < PATTERNS - 8 ? (const void *)(bits + at) : (const void *)&r, sizeof b);
    memcpy(&x, &b, sizeof x);
    return x;
}

static int within(int n, const roln_real *x, roln_real top)
{
    int i, ok = 1;
    for (i = 0; i < n; i++)
        ok &= roln_finite(x[i]) && ROLN_ABS(x[i]) <= top;
    return ok;
}

/* What failed on the way to the guard: nothing, the controller (want NULL), the encoder (z NULL too). */
enum { NOTHING, CONTROLLER, ENCODER, WAYS_TO_FAIL };

/* Everything a guard reads. */
typedef struct {
    roln_real q[MAXN], qd[MAXN], z[MAXN], zd[MAXN], z_min[MAXN], z_max[MAXN], zd_max[MAXN], want[MAXN], held[MAXN];
    roln_limits limits;
    roln_guard g;
    int failed;
} rig;

static roln_trained of_rig(int k, const rig *x)
{
    const roln_trained m = {models[k].md, scale_of(k), x->z_min, x->z_max, x->zd_max, theta_k, NULL};
    return m;
}

static uint32_t tick(int k, rig *x)
{
    const roln_trained m = of_rig(k, x);
    const roln_measured full = {x->q, x->qd};
    const roln_held held = {&x->g, x->held};
    const uint32_t before = x->g.faults;
    const int blind = x->failed == ENCODER;
    const uint32_t f = roln_guard_tick(&m, &x->limits, &full, blind ? NULL : x->z, blind ? NULL : x->zd, x->failed ? NULL : x->want,
                                       &held, ROOM(guard_tick));
    ROOM_KEPT();
    CHECK(x->g.faults == (before | f) && f < 512); /* sticky, nothing else */
    CHECK(!(f & ROLN_FAULT_EXPIRED) || x->limits.safe || all(1, x->held, 0));
    return f;
}

/* A state in range, at a velocity that leaves the energy residual far below the limit, and a guard two good ticks old. */
static void good(int k, rig *x)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    uint64_t s = 300 + (uint64_t)k;
    memset(x, 0, sizeof *x);
    parameters(k, &s, theta_k);
    dyadic(N, 1, &s, x->q), dyadic(N, 1, &s, x->qd);
    dyadic(n, ROLN_C(0.5), &s, x->z), dyadic(n, ROLN_C(0.015625), &s, x->zd), dyadic(F, 1, &s, x->want);
    fill(n, -1, x->z_min), fill(n, 1, x->z_max), fill(n, 2, x->zd_max);
    x->limits.dt = ROLN_C(0.0625), x->limits.margin = ROLN_C(0.25), x->limits.power = 4;
    x->limits.tau = ROLN_C(1.5), x->limits.hold = 3, x->limits.strict = 1;
    CHECK(tick(k, x) == 0 && same(F, x->held, x->want) && tick(k, x) == 0);
    CHECK(x->g.bad == 0 && x->g.known == 1 && x->g.faults == 0);
}

/* What loggers and bus messages keep: the bits of a fault word do not change. */
static void test_fault_bits(void)
{
    CHECK(ROLN_FAULT_INPUT == 1 && ROLN_FAULT_STATUS == 2 && ROLN_FAULT_OUTPUT == 4 && ROLN_FAULT_LIMIT == 8);
    CHECK(ROLN_FAULT_RANGE == 16 && ROLN_FAULT_ENERGY == 32 && ROLN_FAULT_EXPIRED == 64 && ROLN_FAULT_MANIFOLD == 128);
    CHECK(ROLN_CLIPPED == 256);
}

/* A tick by the four functions. */
static uint32_t four_calls(int k, rig *x, const roln_target *ref)
{
    const roln_trained m = of_rig(k, x);
    const roln_motors *motors = x->limits.motors;
    roln_real tau_z[MAXN];
    roln_status st = roln_encode(&m, x->q, x->qd, NULL, x->z, x->zd, NULL, ROOM(encode));
    x->failed = st == ROLN_OK ? NOTHING : ENCODER;
    if (st == ROLN_OK) st = roln_control(&m, x->z, x->zd, ref, tau_z, ROOM(control));
    if (st == ROLN_OK && !motors && m.model->inputs == 0) st = roln_lift(&m, x->z, tau_z, x->want, ROOM(lift));
    else if (st == ROLN_OK) st = roln_allocate(&m, x->z, motors, tau_z, x->want, &x->g.missed, ROOM(allocate));
    if (st != ROLN_OK && x->failed == NOTHING) x->failed = CONTROLLER;
    return tick(k, x);
}

static uint32_t one_call(int k, rig *x, const roln_target *ref)
{
    const roln_trained m = of_rig(k, x);
    const roln_measured full = {x->q, x->qd};
    const roln_held held = {&x->g, x->held};
    const uint32_t f = roln_tick(&m, &x->limits, &full, ref, x->z, x->zd, &held, ROOM(tick));
    ROOM_KEPT();
    return f;
}

/* roln_tick is the four calls, bit for bit, with good and bad numbers, in and out of range and limits; with two motors, or those
   that the model has learned, too. */
static void test_tick(int k, int driven_by_two)
{
    enum { WELL, BAD_Q = 3, BAD_REFERENCE, BAD_RANGE, LOW_TAU, LOW_POWER, CASES };
    const uint32_t most = ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | ROLN_FAULT_LIMIT | ROLN_FAULT_RANGE;
    const roln_real little = ROLN_C(0.0009765625);
    const int N = N_OF(k), n = n_OF(k);
    static rig a, b;
    roln_real r[3 * MAXN], gain[2 * MAXN];
    const roln_target ref = {r, r + n, r + 2 * n, gain, gain + n, NULL};
    static roln_real B[2 * MAXN];
    const int inputs = models[k].md->inputs;
    const roln_motors motors = {driven_by_two ? 2 : 0, driven_by_two ? B : NULL, ROLN_C(0.25)};
    uint64_t s = 330 + (uint64_t)k;
    uint32_t seen = 0;
    int t, i, reached = 0, missed = 0;
    if (driven_by_two && (inputs > 0 || N < 2)) return;
    good(k, &a);
    dyadic(2 * N, 1, &s, B);
    if (driven_by_two || inputs > 0) a.limits.motors = &motors;
    a.limits.q_off = a.limits.qd_off = 100;
    fill(n, -100, a.z_min), fill(n, 100, a.z_max), fill(n, 100, a.zd_max);
    for (t = 0; t < 64; t++) {
        const int what = t % CASES;
        uint32_t f;
        dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd), dyadic(3 * n, 1, &s, r), dyadic(2 * n, 1, &s, gain);
        for (i = 0; i < N; i++)
            a.q[i] /= 16, a.qd[i] /= 64;
        if (what == BAD_Q) a.q[t % N] = (roln_real)NAN;
        if (what == BAD_REFERENCE) r[t % (3 * n)] = (roln_real)INFINITY;
        if (what == BAD_RANGE) a.zd_max[t % n] = t % 16 == BAD_RANGE ? 0 : 100;
        if (t % 16 == 1) a.g.bad = 0, a.g.faults = 0;
        if (t == 40) a.limits.q_off = a.limits.qd_off = 0;
        a.limits.tau = what == LOW_TAU ? little : 1000;
        a.limits.power = what == LOW_POWER ? little : 1000;
        if (t == 48) a.limits.power = 0;
        b = a;
        fill(MAXN, 0, a.want);
        f = four_calls(k, &a, &ref);
        CHECK(one_call(k, &b, &ref) == f);
        CHECK(memcmp(&a.g, &b.g, sizeof a.g) == 0 && same(N, a.held, b.held) && same(n, a.z, b.z) && same(n, a.zd, b.zd));
        seen |= f, reached += f == 0 && a.g.known, missed += a.g.missed > 0 && a.g.missed <= 1;
    }
    CHECK(!a.limits.motors == !missed);
    CHECK(reached > 2); /* all well, the balance known */
    CHECK((seen & (most | ROLN_FAULT_OUTPUT)) == most);
    /* in these few states have any balance */
    CHECK(k == BARE || k == SQUARE || k == WHEEL || inputs > 0 || (seen & ROLN_FAULT_ENERGY));
}

/* Motors that no machine has, with arrays in places of their own (address sanitizer): of one whose damping is none there are two
   numbers, which are held; of one that is not counted none is read, and its torque is 0 where each has a limit, once it has expired
   too. A whole tick does not allocate to them. */
static void test_guard_uncounted(int k, const roln_motors *wrong, const rig *start)
{
    static rig x;
    const roln_trained m = of_rig(k, &x);
    const roln_measured full = {x.q, x.qd};
    const roln_held held = {&x.g, x.held};
    const int F = F_OF(k), two = wrong->count == 2 && wrong->B && models[k].md->inputs == 0;
    const size_t size = (size_t)(two ? 2 : 1) * sizeof(roln_real);
    roln_real zero[5 * MAXN] = {0};
    const roln_target ref = {zero, zero, zero, zero, zero, NULL};
    roln_real *own[4];
    int i, t;
    for (i = 0; i < 4; i++) {
        own[i] = (roln_real *)malloc(size);
        fill(two ? 2 : 1, i == 0 ? (roln_real)NAN : ROLN_C(1.5), own[i]);
    }
    x = *start, x.limits.motors = wrong;
    CHECK((one_call(k, &x, &ref) & (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS)) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
    CHECK(same(F, x.held, start->held));
    x = *start, x.limits.motors = wrong, x.limits.hold = 1;
    x.limits.tau_each = own[1], x.limits.rate_each = own[2], x.limits.safe = own[3];
    for (t = 0; t < 2; t++) {
        const uint32_t f = roln_guard_tick(&m, &x.limits, &full, x.z, x.zd, own[0], &held, ROOM(guard_tick));
        CHECK((f & ROLN_FAULT_INPUT) && !(f & ROLN_CLIPPED) && !(f & ROLN_FAULT_EXPIRED) == !t);
        if (two) CHECK(t ? all(2, x.held, ROLN_C(1.5)) : same(2, x.held, start->held));
        else CHECK(all(F, x.held, 0));
    }
    for (i = 0; i < 4; i++)
        free(own[i]);
}

/* Motors u, tau = B u, are to a guard what the joints' tau = B u is: the same residual of energy. Motors that no machine has are a
   fault, and the torque is held. */
static void test_guard_motors(int k)
{
    static rig a, b, bad;
    static roln_real B[2 * MAXN];
    const int N = N_OF(k), n = n_OF(k), inputs = models[k].md->inputs;
    const roln_motors one = {1, B, 0}, two = {2, B, 0};
    const roln_motors wrong[5] = {{0, B, 0}, {N + 1, B, 0}, {2, B, -1}, {2, B, (roln_real)NAN}, {2, inputs > 0 ? B : NULL, 0}};
    uint64_t s = 360 + (uint64_t)k;
    int t, i, known = 0;
    good(k, &bad);
    dyadic(2 * N, ROLN_C(0.25), &s, B);
    for (i = 0; i < 5; i++) {
        rig x = bad;
        x.limits.motors = wrong + i;
        CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && x.g.bad == 1 && same(F_OF(k), x.held, bad.held));
        test_guard_uncounted(k, wrong + i, &bad);
    }
    good(k, &a);
    memset(&a.g, 0, sizeof a.g);
    fill(MAXN, 0, a.held);
    a.limits.tau = 100, a.limits.power = 1000, b = a;
    if (inputs == 0) {
        b.limits.motors = &one;
        CHECK(tick(k, &b) == 0 && same(1, b.held, b.want) && all(MAXN - 1, b.held + 1, 0));
        b = a;
    }
    if (inputs > 0 || N < 2) return;
    a.limits.motors = &two;
    for (t = 0; t < 10; t++) {
        dyadic(2, 1, &s, a.want), dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd);
        dyadic(n, ROLN_C(0.5), &s, a.z), dyadic(n, ROLN_C(0.0625), &s, a.zd);
        memcpy(b.z, a.z, sizeof a.z), memcpy(b.zd, a.zd, sizeof a.zd);
        memcpy(b.q, a.q, sizeof a.q), memcpy(b.qd, a.qd, sizeof a.qd);
        for (i = 0; i < N; i++)
            b.want[i] = B[2 * i] * a.want[0] + B[2 * i + 1] * a.want[1];
        a.want[2] = (roln_real)NAN; /* is nobody's torque */
        CHECK(tick(k, &a) == 0 && tick(k, &b) == 0);
        CHECK(same(2, a.held, a.want) && all(N - 2, a.held + 2, 0));
        BOUND("residual of motors, eps", fabsl((ld)a.g.residual - (ld)b.g.residual) / EPS, 20);
        known += a.g.known && b.g.known && ROLN_ABS(b.g.residual) > ROLN_C(0.001);
    }
    CHECK(known > 5);
}

/* The very first tick, with NaN among the measured numbers: the latent state is not read (here it has never been written, which
   memory sanitizers see) and not written, the torque is 0, then what a good tick gave, for `hold` ticks. */
static void test_first_tick(int k)
{
    const int N = N_OF(k), n = n_OF(k);
    static rig start, x;
    roln_real zero[5 * MAXN] = {0}, torque[MAXN];
    const roln_target ref = {zero, zero, zero, zero, zero, NULL};
    const roln_held held = {&x.g, x.held};
    roln_real *unset = (roln_real *)malloc((size_t)(2 * n) * sizeof *unset);
    uint64_t s = 335 + (uint64_t)k;
    int i, t;
    const roln_motors damped = {0, NULL, ROLN_C(0.25)};
    memset(&start, 0, sizeof start);
    valid(k, &s);
    if (models[k].md->inputs > 0) start.limits.motors = &damped;
    dyadic(N, ROLN_C(0.125), &s, start.q), dyadic(N, ROLN_C(0.125), &s, start.qd);
    start.limits.dt = ROLN_C(0.0625), start.limits.power = 1000, start.limits.q_off = start.limits.qd_off = 1000;
    start.limits.tau = 1000, start.limits.hold = 3;
    fill(n, -1000, start.z_min), fill(n, 1000, start.z_max), fill(n, 1000, start.zd_max);
    memset(start.z, 0xa5, sizeof start.z), memset(start.zd, 0x5a, sizeof start.zd);
    for (i = 0; i < 2 * N; i++) {
        const roln_trained m = of_rig(k, &x);
        const roln_measured full = {x.q, x.qd};
        x = start;
        (i < N ? x.q : x.qd)[i % N] = (roln_real)NAN;
        CHECK(one_call(k, &x, &ref) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
        CHECK(memcmp(x.z, start.z, sizeof x.z) == 0 && memcmp(x.zd, start.zd, sizeof x.zd) == 0);
        CHECK(all(N, x.held, 0) && x.g.bad == 1 && x.g.known == 0);
        CHECK(roln_tick(&m, &x.limits, &full, &ref, unset, unset + n, &held, ROOM(tick)) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
        CHECK(all(N, x.held, 0) && x.g.bad == 2);
    }
    free(unset);
    memcpy(x.q, start.q, sizeof x.q), memcpy(x.qd, start.qd, sizeof x.qd);
    CHECK(one_call(k, &x, &ref) == 0 && x.g.bad == 0);
    memcpy(torque, x.held, sizeof torque);
    x.q[0] = (roln_real)NAN;
    for (t = 1; t <= 4; t++) {
        const uint32_t expired = t > 3 ? ROLN_FAULT_EXPIRED : 0;
        CHECK(one_call(k, &x, &ref) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | expired));
        CHECK(expired ? all(N, x.held, 0) : same(N, x.held, torque));
    }
}

/* The numbers that a guard reads, by name. */
enum {
    F_Q,
    F_QD,
    F_Z,
    F_ZD,
    F_WANT,
    F_HELD,
    F_MARGIN,
    F_POWER,
    F_TAU,
    F_DT,
    F_ENERGY,
    F_LAST_POWER,
    F_Z_MIN,
    F_Z_MAX,
    F_ZD_MAX,
    FIELDS
};
static const char *const field_names[FIELDS] = {"q",   "qd", "z",      "zd",         "want",  "held",  "margin", "power",
                                                "tau", "dt", "energy", "last power", "z_min", "z_max", "zd_max"};

static roln_real *field_of(rig *x, int field, int i)
{
    roln_real *const at[FIELDS] = {x->q + i,     x->qd + i,         x->z + i,         x->zd + i,      x->want + i,
                                   x->held + i,  &x->limits.margin, &x->limits.power, &x->limits.tau, &x->limits.dt,
                                   &x->g.energy, &x->g.power,       x->z_min + i,     x->z_max + i,   x->zd_max + i};
    return at[field];
}

static int field_size(int k, int field)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    const int size[FIELDS] = {N, N, n, n, F, F, 1, 1, 1, 1, 1, 1, n, n, n};
    return size[field];
}

/* The faults that a number v in a field must give. */
static uint32_t must_fault(int k, int field, int i, roln_real v, int failed)
{
    const int finite = roln_finite(v), nan = v != v;
    const int sees = failed != ENCODER, angle = i < n_OF(k) && roln_lnn_angle(&models[k].md->lnn, i);
    switch (field) {
    case F_Q:
    case F_QD: return finite ? 0 : ROLN_FAULT_INPUT;
    case F_Z: return sees && !(ROLN_ABS(v) <= (angle ? ROLN_C(1048576.0) : ROLN_C(1.5))) ? ROLN_FAULT_RANGE : 0;
    case F_ZD: return sees && !(ROLN_ABS(v) <= ROLN_C(2.5)) ? ROLN_FAULT_RANGE : 0;
    case F_WANT:
        if (failed != NOTHING) return 0;
        if (!finite) return ROLN_FAULT_OUTPUT;
        return ROLN_ABS(v) <= ROLN_C(1.5) ? 0 : ROLN_FAULT_LIMIT;
    case F_DT: return finite && v > 0 ? 0 : ROLN_FAULT_INPUT; /* no time passed, or it ran backwards */
    case F_MARGIN:
    case F_POWER:
    case F_TAU: return finite ? 0 : ROLN_FAULT_INPUT; /* a limit that is none limits nothing */
    case F_ENERGY:
    case F_LAST_POWER: return finite || failed != NOTHING ? 0 : ROLN_FAULT_ENERGY;
    case F_Z_MIN:
    case F_Z_MAX: return nan && sees && !angle ? ROLN_FAULT_RANGE : 0;
    case F_ZD_MAX: return nan && sees ? ROLN_FAULT_RANGE : 0;
    default: return 0;
    }
}

/* Mended: good again at the second good tick at the latest (the first may still see the jump in energy), its faults remembered. */
static int recovers(int k, const rig *start, rig *x, uint32_t must)
{
    const roln_guard g = x->g;
    roln_real held[MAXN];
    uint32_t f = 0;
    int after;
    memcpy(held, x->held, sizeof held);
    *x = *start, x->g = g;
    memcpy(x->held, held, sizeof held);
    for (after = 0; after < 2; after++) {
        f = tick(k, x);
        CHECK(within(F_OF(k), x->held, x->limits.tau) && (x->g.faults & must) == must);
        if (after == 0 && f) CHECK(f == ROLN_FAULT_ENERGY);
    }
    return f == 0 && same(F_OF(k), x->held, x->want);
}

/* Every pattern in every number, alone and together with another fault (so that the old torque would be held). */
static void test_guard_patterns(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    int field, i, p, failed;
    good(k, &start);
    for (field = 0; field < FIELDS; field++)
        for (i = 0; i < field_size(k, field); i++)
            for (p = 0; p < PATTERNS; p++)
                for (failed = 0; failed < WAYS_TO_FAIL; failed++) {
                    const roln_real v = pattern(p);
                    const uint32_t must = must_fault(k, field, i, v, failed) | (failed ? ROLN_FAULT_STATUS : 0u);
                    roln_real top;
                    uint32_t f;
                    int ok;
                    x = start, x.failed = failed;
                    *field_of(&x, field, i) = v;
                    top = x.limits.tau >= 0 ? x.limits.tau : 0; /* no torque at all under a limit that is none */
                    f = tick(k, &x);
                    ok = within(F, x.held, top) && (f & must) == must;
                    if (f == 0) ok &= same(F, x.held, x.want);                              /* no fault: what was wanted */
                    if (field <= F_QD && roln_finite(v) && failed == NOTHING) ok &= f == 0; /* any finite measurement is one */
                    if (!CHECK(ok))
                        printf("    model %d, %s[%d] = %g (pattern %d), failed %d: faults %u, torque %g, limit %g\n", k,
                               field_names[field], i, (double)v, p, failed, (unsigned)f, (double)x.held[0], (double)x.limits.tau);
                    if (!CHECK(recovers(k, &start, &x, must)))
                        printf("    model %d, %s[%d] = %g does not recover\n", k, field_names[field], i, (double)v);
                }
    for (failed = 1; failed < WAYS_TO_FAIL; failed++) {
        x = start, x.failed = failed;
        CHECK(tick(k, &x) == ROLN_FAULT_STATUS && within(F, x.held, ROLN_C(1.5)) && same(F, x.held, start.held));
    }
}

/* The torque of the last tick counts if it is as large as the limit allows, and no larger. */
static void test_guard_held(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    int i, sign;
    good(k, &start);
    start.failed = CONTROLLER;
    for (i = 0; i < F; i++)
        for (sign = -1; sign < 2; sign += 2) {
            const roln_real edge = (roln_real)sign * start.limits.tau;
            x = start, x.held[i] = edge;
            CHECK(tick(k, &x) == ROLN_FAULT_STATUS && all(1, x.held + i, edge));
            x = start, x.held[i] = edge * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_STATUS && all(1, x.held + i, 0));
        }
}

/* A balance that is not known, or not finite, is a fault where a limit asks for it, and nothing to compare the next tick with. */
static void test_guard_unknown(int k)
{
    static rig start, x;
    const roln_real huge = PICK(1e30f, 1e290), fast = PICK(1e12f, 1e100);
    const int F = F_OF(k), P = roln_ae_params(&models[k].md->ae) + rolni_base_at(&models[k].md->lnn);
    good(k, &start);
    fill(n_OF(k), huge, start.zd_max);
    start.limits.tau = PICK(1e35f, 1e295), start.g.known = 0;

    x = start, x.zd[0] = huge; /* T overflows */
    fill(F, 0, x.held), fill(F, 0, x.want);
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.known == 0);
    x.limits.power = 0;
    CHECK(tick(k, &x) == 0 && x.g.known == 0);

    x = start, x.zd[0] = fast; /* the power of the torque of the last tick overflows */
    fill(F, huge, x.held), fill(F, 0, x.want);
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.known == 0);

    x = start, x.zd[0] = fast; /* that of the new torque does */
    fill(F, 0, x.held), fill(F, huge, x.want);
    CHECK(tick(k, &x) == 0 && x.g.known == 0 && same(F, x.held, x.want));

    if (!models[k].md->lnn.base) return;
    good(k, &x);
    theta_k[P] = -1; /* no mass matrix */
    CHECK(tick(k, &x) == ROLN_FAULT_STATUS && x.g.known == 0);
    x.limits.power = 0;
    CHECK(tick(k, &x) == 0);
}

/* What z does not see: q, qd off the manifold, in any joint; limits of 0 do not look, limits that are none are a fault. */
static void test_guard_manifold(int k)
{
    static rig start, x;
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    const roln_real off = ROLN_C(0.015625), bad[3] = {-1, (roln_real)NAN, (roln_real)INFINITY};
    int i, side;
    good(k, &start);
    CHECK_OK(roln_decode(&m, start.z, start.zd, start.q, start.qd, ROOM(decode)));
    start.limits.q_off = off, start.limits.qd_off = 2 * off;
    x = start;
    CHECK(tick(k, &x) == 0);
    for (i = 0; i < N; i++)
        for (side = -1; side < 2; side += 2) {
            const roln_real s = (roln_real)side;
            x = start, x.q[i] += ROLN_C(0.875) * s * off, x.qd[i] += ROLN_C(1.75) * s * off;
            CHECK(tick(k, &x) == 0);
            x = start, x.q[i] += ROLN_C(1.125) * s * off;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x.limits.q_off = 0;
            CHECK(tick(k, &x) == 0);
            x = start, x.qd[i] += ROLN_C(2.25) * s * off;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x.limits.qd_off = 0;
            CHECK(tick(k, &x) == 0);
            x = start, x.q[i] = s * (roln_real)INFINITY; /* bad numbers are nowhere, not off the manifold */
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
            x = start, x.qd[i] = (roln_real)NAN;
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
        }
    for (i = 0; i < 3; i++) {
        x = start, x.limits.q_off = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
        x = start, x.limits.qd_off = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = F_MARGIN; i <= F_TAU; i++) { /* a negative limit is none */
        x = start;
        *field_of(&x, i, 0) = -1;
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = 0; i < 3; i++) { /* an old torque that is none, under a limit that is none */
        const roln_real none[3] = {(roln_real)INFINITY, -(roln_real)INFINITY, (roln_real)NAN};
        x = start, x.limits.tau = (roln_real)INFINITY;
        x.held[F_OF(k) - 1] = none[i];
        CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && within(F_OF(k), x.held, x.limits.power));
    }
    x = start, x.z[n - 1] = (roln_real)NAN;
    CHECK((tick(k, &x) & (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE)) == (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE));
}

/* Counters out of order: whatever bad, known, faults and hold are, the torque is safe and a corrupted count does not hold for
   ever. */
static void test_guard_counters(int k)
{
    static const int counts[9] = {-2147483647 - 1, -2147483647, -1, 0, 1, 4, 1000, 2147483646, 2147483647};
    const int F = F_OF(k);
    static rig start, x;
    int b, h, t;
    good(k, &start);
    for (b = 0; b < 9; b++)
        for (h = 0; h < 9; h++) {
            x = start, x.g.bad = counts[b], x.limits.hold = counts[h], x.g.known = counts[(b + h) % 9];
            x.failed = CONTROLLER;
            for (t = 0; t < 4; t++) {
                const uint32_t f = tick(k, &x);
                CHECK((f & ROLN_FAULT_STATUS) && within(F, x.held, x.limits.tau));
                CHECK(((f & ROLN_FAULT_INPUT) != 0) == (counts[h] < 0));
                if (counts[h] <= 0 || counts[b] < 0) CHECK(f & ROLN_FAULT_EXPIRED); /* no holding; a count below zero is none */
            }
        }
    for (b = 0; b < 128; b++) { /* any fault word: EXPIRED stays, the others do not matter */
        x = start, x.g.faults = (uint32_t)b;
        CHECK(tick(k, &x) == ((uint32_t)b & ROLN_FAULT_EXPIRED) && x.g.faults == (uint32_t)b);
    }
}

/* A bad torque is held for exactly `hold` ticks; then it is too late until the guard is zeroed. */
static void check_hold(int k, const rig *start, int hold)
{
    const int F = F_OF(k);
    static rig x;
    roln_real last[MAXN];
    int t;
    x = *start, x.limits.hold = hold;
    memcpy(last, x.held, sizeof last);
    for (t = 1; t <= hold + 3; t++) {
        const uint32_t expired = t > hold ? ROLN_FAULT_EXPIRED : 0;
        x.want[0] = (roln_real)NAN;
        CHECK(tick(k, &x) == (ROLN_FAULT_OUTPUT | expired));
        CHECK(expired ? all(F, x.held, 0) : same(F, x.held, last));
    }
    x.want[0] = last[0];
    for (t = 0; t < 5; t++)
        CHECK((tick(k, &x) & ~(uint32_t)ROLN_FAULT_ENERGY) == ROLN_FAULT_EXPIRED && all(F, x.held, 0));
    CHECK((x.g.faults & ~(uint32_t)ROLN_FAULT_ENERGY) == (ROLN_FAULT_OUTPUT | ROLN_FAULT_EXPIRED));
    memset(&x.g, 0, sizeof x.g);
    CHECK(tick(k, &x) == 0 && same(F, x.held, x.want) && x.g.faults == 0);
}

/* A coordinate that is no angle. */
static int bounded(int k)
{
    return roln_lnn_angle(&models[k].md->lnn, 0) ? 1 : 0;
}

/* Makes one of five things wrong, or none; the fault that it is. */
static uint32_t go_wrong(int k, int what, int F, rig *x)
{
    switch (what) {
    case 0: x->qd[0] = (roln_real)INFINITY; return ROLN_FAULT_INPUT;
    case 1: x->failed = CONTROLLER; return ROLN_FAULT_STATUS;
    case 2: x->want[F - 1] = (roln_real)NAN; return ROLN_FAULT_OUTPUT;
    case 3: x->want[0] = ROLN_C(-1.5) * (1 + 2 * ROLN_EPS); return ROLN_FAULT_LIMIT;
    case 4: x->z[bounded(k)] = 3; return ROLN_FAULT_RANGE;
    case 5: x->failed = ENCODER; return ROLN_FAULT_STATUS;
    default: return 0;
    }
}

/* Random good and bad ticks against a counter. */
static void test_guard_hold(int k)
{
    const int F = F_OF(k);
    static rig start, x;
    roln_real last[MAXN];
    uint64_t s = 310 + (uint64_t)k;
    int hold, t, i, run, bad, over;
    good(k, &start);
    for (hold = 0; hold <= 5; hold++)
        check_hold(k, &start, hold);
    for (run = 0; run < 200; run++) {
        x = start, x.limits.power = run % 2 ? 0 : start.limits.power, x.limits.hold = roln_randint(4, &s);
        memcpy(last, x.held, sizeof last);
        for (bad = over = 0, t = 0; t < 40; t++) {
            uint32_t want;
            memcpy(x.z, start.z, sizeof x.z), memcpy(x.qd, start.qd, sizeof x.qd), x.failed = NOTHING;
            for (i = 0; i < F; i++)
                x.want[i] = start.held[i] * (1 + (roln_real)(t % 3) / 64);
            want = go_wrong(k, roln_randint(12, &s), F, &x);
            bad = want || over ? bad + 1 : 0;
            over |= bad > x.limits.hold;
            for (i = 0; i < F && !want; i++)
                last[i] = x.want[i];
            if (over) want |= ROLN_FAULT_EXPIRED;
            CHECK(tick(k, &x) == want);
            CHECK(over ? all(F, x.held, 0) : same(F, last, x.held));
        }
    }
}

/* Margins: the edge is in, the next number is out. */
static void test_guard_range(int k)
{
    const int n = n_OF(k);
    static rig start, x;
    int i, side;
    good(k, &start);
    start.limits.power = 0, start.g.known = 0;
    for (i = 0; i < n; i++)
        for (side = 0; side < 4; side++) {
            const int angle = side < 2 && roln_lnn_angle(&models[k].md->lnn, i);
            const roln_real sign = side % 2 ? 1 : -1, edge = angle ? ROLN_C(1048576.0) : side < 2 ? ROLN_C(1.5) : ROLN_C(2.5);
            x = start;
            (side < 2 ? x.z : x.zd)[i] = sign * edge;
            CHECK(tick(k, &x) == 0);
            (side < 2 ? x.z : x.zd)[i] = sign * edge * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_RANGE);
            x = start, x.want[0] = sign * x.limits.tau;
            CHECK(tick(k, &x) == 0);
            x.want[0] = sign * x.limits.tau * (1 + ROLN_EPS);
            CHECK(tick(k, &x) == ROLN_FAULT_LIMIT);
        }
}

/* One number for every joint, or each its own: what a torque is clipped to, as a fault where limits are strict. */
static void test_guard_clip(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, own, sign;
    good(k, &start);
    start.limits.strict = 0;
    for (i = 0; i < F; i++)
        each[i] = ROLN_C(1.25) + (roln_real)i / 64, rates[i] = 2 + (roln_real)i;
    for (own = 0; own < 2; own++)
        for (i = 0; i < F; i++)
            for (sign = -1; sign < 2; sign += 2) {
                const roln_real s = (roln_real)sign, top = own ? each[i] : start.limits.tau;
                const roln_real last = start.held[i], step = s * (own ? rates[i] : 2) * start.limits.dt;
                roln_real want[MAXN];
                x = start;
                if (own) x.limits.tau_each = each, x.limits.tau = 0; /* tau is not read */
                memcpy(want, x.want, sizeof want);
                x.want[i] = want[i] = s * top; /* the edge is in */
                CHECK(tick(k, &x) == 0 && same(F, x.held, want));
                x.want[i] = s * top * (1 + ROLN_EPS);
                CHECK(tick(k, &x) == ROLN_CLIPPED && same(F, x.held, want) && x.g.bad == 0 && x.g.known);
                x.want[i] = s * PICK(1e38f, 1e300);
                CHECK(tick(k, &x) == ROLN_CLIPPED && same(F, x.held, want));
                x.failed = CONTROLLER; /* what is not applied is not clipped; what was clipped may be held */
                CHECK(tick(k, &x) == ROLN_FAULT_STATUS && same(F, x.held, want));
                x.failed = NOTHING, x.limits.strict = 1;
                CHECK(tick(k, &x) == ROLN_FAULT_LIMIT && same(F, x.held, want));
                x = start, x.z[bounded(k)] = 3, x.want[i] = 2 * s; /* another fault: nothing is clipped, the last torque is held */
                CHECK(tick(k, &x) == ROLN_FAULT_RANGE && same(F, x.held, start.held));
                x = start, x.limits.rate = own ? 0 : 2; /* by its rate: once, and once more; then it is there */
                if (own) x.limits.rate_each = rates;
                x.want[i] = last + ROLN_C(1.5) * step;
                CHECK(tick(k, &x) == ROLN_CLIPPED && all(1, x.held + i, last + step) && x.g.bad == 0);
                x.held[i] = x.want[i] = last;
                CHECK(tick(k, &x) == 0 && same(F, x.held, start.held));
                x.want[i] = last + ROLN_C(1.5) * step, x.limits.strict = 1;
                CHECK(tick(k, &x) == ROLN_FAULT_LIMIT && same(F, x.held, start.held));
            }
    x = start, x.limits.rate = 8; /* from nothing, half a unit a tick */
    memset(&x.g, 0, sizeof x.g);
    fill(F, 0, x.held), fill(F, ROLN_C(1.25), x.want);
    CHECK(tick(k, &x) == ROLN_CLIPPED && all(F, x.held, ROLN_C(0.5)));
    CHECK(tick(k, &x) == ROLN_CLIPPED && all(F, x.held, 1));
    CHECK(tick(k, &x) == 0 && all(F, x.held, ROLN_C(1.25)) && x.g.faults == ROLN_CLIPPED);
}

/* Whatever is wanted, and whatever the last torque was: within the limits of torque, and of rate after one that was, too. */
static void test_guard_clip_patterns(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, p, r;
    good(k, &start);
    for (i = 0; i < F; i++)
        each[i] = ROLN_C(1.25) + (roln_real)i / 64, rates[i] = (roln_real)i;
    start.limits.strict = 0, start.limits.power = 0, start.limits.tau_each = each, start.limits.rate_each = rates;
    for (i = 0; i < F; i++)
        for (p = 0; p < PATTERNS; p++)
            for (r = 0; r < PATTERNS; r++) {
                const roln_real want = pattern(p), held = pattern(r);
                const roln_real last = ROLN_ABS(held) <= each[i] ? held : 0, step = rates[i] * start.limits.dt;
                uint32_t f;
                x = start, x.want[i] = want, x.held[i] = held;
                f = tick(k, &x);
                CHECK(roln_finite(x.held[i]) && ROLN_ABS(x.held[i]) <= each[i]);
                CHECK(i == 0 || ROLN_ABS(x.held[i] - last) <= step + 4 * ROLN_EPS); /* 0: no bound of the rate */
                if (!roln_finite(want)) CHECK(f == ROLN_FAULT_OUTPUT);
                else CHECK(f == (all(1, x.held + i, want) ? 0 : (uint32_t)ROLN_CLIPPED));
            }
}

/* Limits of single joints, rates and windows that are none. */
static void test_guard_limits(int k)
{
    const roln_real bad[3] = {-1, (roln_real)NAN, (roln_real)INFINITY};
    static rig start, x;
    const int F = F_OF(k);
    roln_real each[MAXN], rates[MAXN];
    int i, b;
    good(k, &start);
    fill(MAXN, 2, each), fill(MAXN, 100, rates);
    start.limits.tau_each = each, start.limits.rate_each = rates;
    x = start;
    CHECK(tick(k, &x) == 0);
    for (b = 0; b < 3; b++) {
        for (i = 0; i < F; i++) {
            x = start, each[i] = bad[b];
            CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && within(F, x.held, 2) && (b == 2 || all(1, x.held + i, 0)));
            each[i] = 2, rates[i] = bad[b];
            x = start;
            CHECK(tick(k, &x) == ROLN_FAULT_INPUT && same(F, x.held, start.held));
            rates[i] = 100;
        }
        x = start, x.limits.rate_each = NULL, x.limits.rate = bad[b];
        CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
    }
    x = start, x.limits.window = -1;
    CHECK(tick(k, &x) == ROLN_FAULT_INPUT);
    x = start, x.limits.tau_each = NULL, x.limits.tau = -1; /* nothing at all under a limit that is none */
    CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && all(F, x.held, 0));
}

/* Once expired, the torque is the user's, within the limit, and 0 where that is no number. Held torques are as before. */
static void test_guard_safe(int k)
{
    static rig start, x;
    const int F = F_OF(k);
    roln_real safe[MAXN], clipped[MAXN];
    uint32_t flipped;
    int t, p, i;
    good(k, &start);
    for (i = 0; i < F; i++)
        safe[i] = (roln_real)(i + 1) / 16;
    start.limits.safe = safe, start.limits.rate = 1, start.failed = CONTROLLER;
    for (t = 1; t <= 3; t++)
        CHECK(tick(k, &start) == ROLN_FAULT_STATUS && same(F, start.held, start.want));
    for (p = 0; p < PATTERNS; p++) { /* at once, in spite of the rate; and it may change from tick to tick */
        const roln_real v = pattern(p);
        memcpy(clipped, safe, sizeof clipped);
        clipped[F - 1] = !roln_finite(v) ? 0 : v < ROLN_C(-1.5) ? ROLN_C(-1.5) : v > ROLN_C(1.5) ? ROLN_C(1.5) : v;
        x = start, safe[F - 1] = v;
        x.failed = p % WAYS_TO_FAIL;
        x.g.faults |= ROLN_FAULT_EXPIRED; /* as somebody may who stops it from outside */
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, clipped));
        safe[F - 1] = clipped[F - 1] = ROLN_C(0.125);
        x.failed = NOTHING;
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, clipped));
        x.limits.tau = (roln_real)NAN;
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && all(F, x.held, 0));
    }
    x = start;
    CHECK(tick(k, &x) == (ROLN_FAULT_STATUS | ROLN_FAULT_EXPIRED) && same(F, x.held, safe));
    start = x, start.failed = NOTHING;
    for (p = 0; p < 64; p++) { /* a bit that flips in the count or in the faults does not arm the motors */
        x = start;
        if (p < 32) x.g.faults ^= (uint32_t)1 << p;
        else {
            memcpy(&flipped, &x.g.bad, sizeof flipped);
            flipped ^= (uint32_t)1 << (p - 32);
            memcpy(&x.g.bad, &flipped, sizeof flipped);
        }
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, safe));
        CHECK((tick(k, &x) & ROLN_FAULT_EXPIRED) && same(F, x.held, safe) && x.g.bad == -1);
    }
}

/* The running mean of the residual: R += (r - R) / window, of the residuals r that a guard without a window has; it decides. */
static void test_guard_window(int k)
{
    enum { WINDOW = 5 };
    static rig a, b, both[2];
    const int n = n_OF(k);
    uint64_t s = 350 + (uint64_t)k;
    ld mean = 0, bound = 0;
    int t, found = 0, quiet = 0;
    good(k, &a);
    a.limits.power = PICK(1e30f, 1e30), a.g.residual = 0, b = a, b.limits.window = WINDOW;
    for (t = 0; t < 60; t++) {
        uint32_t f;
        ld power;
        dyadic(n, ROLN_C(0.5), &s, a.zd);
        memcpy(b.zd, a.zd, sizeof b.zd);
        both[1] = b;
        CHECK(tick(k, &a) == 0 && tick(k, &b) == 0);
        mean += ((ld)a.g.residual - mean) / WINDOW;
        bound = fabsl(mean) > bound ? fabsl(mean) : bound;
        CHECK_NEAR(b.g.residual, mean, 8 * (ld)ROLN_EPS * bound);
        power = fabsl(mean) * (t % 2 ? 1.01L : 0.99L); /* a limit just above it, and just below */
        if (!(power > 1e-3L * bound) || power < 1e-6L) continue;
        both[1].limits.power = (roln_real)power;
        f = tick(k, both + 1);
        CHECK(f == (t % 2 ? 0 : ROLN_FAULT_ENERGY));
        found += f != 0, quiet += f == 0;
    }
    CHECK(k == BARE || k == SQUARE || (found > 10 && quiet > 10));
    b.g.residual = (roln_real)NAN; /* a damaged one is a fault, and gone */
    CHECK(tick(k, &b) == ROLN_FAULT_ENERGY && roln_finite(b.g.residual) && tick(k, &b) == 0);
}

/* An angle's error goes the shorter way, and its turns change neither control nor what a guard sees. */
static void test_turns(void)
{
    const int k = WHEEL, n = wheel_n;
    const roln_trained m = of_model(k);
    const roln_real turn = 2 * ROLNI_PI, far = ROLN_C(3.0), little = ROLN_C(0.0009765625);
    roln_real r[3 * wheel_n] = {0}, gain[2 * wheel_n], tau[2][wheel_n], z[wheel_n], zd[wheel_n] = {0};
    const roln_target ref = {r, r + n, r + 2 * n, gain, gain + n, NULL};
    static rig x, start;
    int i, j;
    good(k, &start);
    fill(n, 4, gain), fill(n, 0, gain + n);
    for (i = 0; i < n; i++)
        for (j = 0; j < 2; j++) { /* from -3 to 3 by .28 rad backwards, not by 6 forwards */
            fill(n, 0, z), fill(3 * n, 0, r);
            z[i] = -far, r[i] = j ? far : -far;
            CHECK_OK(roln_control(&m, z, zd, &ref, tau[j], ROOM(control)));
            if (j == 1) CHECK_NEAR(tau[1][i] - tau[0][i], 4 * (i == 1 ? 2 * (ld)far : 2 * (ld)far - (ld)turn), 40 * EPS);
        }
    memcpy(start.q, start.z, sizeof start.q), memcpy(start.qd, start.zd, sizeof start.qd);
    start.limits.q_off = start.limits.qd_off = little;
    for (i = 0; i < n; i++) /* measured on another turn than the state: the same place; of a slider it is not */
        for (j = -1; j < 2; j += 2) {
            x = start, x.q[i] += (roln_real)j * turn;
            CHECK(tick(k, &x) == (i == 1 ? ROLN_FAULT_MANIFOLD : 0));
            x = start, x.q[i] += 4 * little;
            CHECK(tick(k, &x) == ROLN_FAULT_MANIFOLD);
            x = start, x.z[i] = x.q[i] = x.z[i] + 20 * (roln_real)j * turn; /* no jump of energy by a turn */
            CHECK(tick(k, &x) == (i == 1 ? ROLN_FAULT_RANGE : 0));
        }
}

/* ---- limits from recordings ------------------------------------------------------------------- */

enum { TICKS = 12, RUNS = 2 };

/* Two recordings of any motion near the manifold. */
typedef struct {
    roln_real q[RUNS * TICKS * MAXN], qd[RUNS * TICKS * MAXN], tau[RUNS * TICKS * MAXN];
} recordings;

static void record(int k, recordings *r)
{
    const roln_trained m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    uint64_t s = 360 + (uint64_t)k;
    roln_real z[MAXN], zd[MAXN], off[2 * MAXN];
    int t, i;
    for (t = 0; t < RUNS * TICKS; t++) {
        dyadic(n, ROLN_C(0.5), &s, z), dyadic(n, ROLN_C(0.25), &s, zd), dyadic(2 * N, ROLN_C(0.015625), &s, off);
        CHECK_OK(roln_decode(&m, z, zd, r->q + t * N, r->qd + t * N, spare));
        for (i = 0; i < N; i++)
            r->q[t * N + i] += off[i], r->qd[t * N + i] += off[N + i];
    }
    dyadic(RUNS * TICKS * F_OF(k), 1, &s, r->tau);
    for (i = 0; i < RUNS * TICKS * F_OF(k); i++) /* the first torque is no change */
        r->tau[i] += 3;
}

/* All faults of a guard along the recordings. */
static uint32_t faults_along(int k, const recordings *r, const rig *start, const roln_limits *limits)
{
    const int N = N_OF(k), F = F_OF(k);
    static rig x;
    uint32_t f = 0;
    int t;
    for (t = 0; t < RUNS * TICKS; t++) {
        const roln_trained m = of_rig(k, start);
        if (t % TICKS == 0) {
            x = *start, x.limits = *limits, x.limits.hold = 2000000000;
            memcpy(x.held, r->tau + t * F, sizeof *x.held * (size_t)F);
        }
        memcpy(x.q, r->q + t * N, sizeof *x.q * (size_t)N), memcpy(x.qd, r->qd + t * N, sizeof *x.qd * (size_t)N);
        memcpy(x.want, r->tau + t * F, sizeof *x.want * (size_t)F);
        CHECK_OK(roln_encode(&m, x.q, x.qd, NULL, x.z, x.zd, NULL, spare));
        f |= tick(k, &x);
        memcpy(x.held, x.want, sizeof x.held);
    }
    return f;
}

/* Silent along what they were made of, and not with two per cent less of any. */
static void check_least(int k, const recordings *r, const rig *start, const roln_limits *l)
{
    const roln_real less = ROLN_C(0.98);
    roln_real each[MAXN], rates[MAXN];
    roln_limits low;
    int i, what;
    CHECK(faults_along(k, r, start, l) == 0);
    for (what = 0; what < 4; what++) {
        const uint32_t want[4] = {ROLN_FAULT_RANGE, ROLN_FAULT_ENERGY, ROLN_FAULT_MANIFOLD, ROLN_FAULT_MANIFOLD};
        roln_real *const field[4] = {&low.margin, &low.power, &low.q_off, &low.qd_off};
        low = *l;
        if (!(*field[what] > ROLN_C(1e-4))) continue; /* nothing there: no autoencoder */
        *field[what] *= less;
        if (want[what] != ROLN_FAULT_ENERGY) low.power = 0; /* after a bad tick it is of the torque that was held */
        CHECK(faults_along(k, r, start, &low) == want[what]);
    }
    for (i = 0; i < F_OF(k); i++)
        for (what = 0; what < 2; what++) {
            memcpy(each, l->tau_each, sizeof each), memcpy(rates, l->rate_each, sizeof rates);
            low = *l, low.tau_each = each, low.rate_each = rates, low.power = 0;
            (what ? each : rates)[i] *= less;
            CHECK(faults_along(k, r, start, &low) == ROLN_FAULT_LIMIT);
            low.strict = 0;
            CHECK(faults_along(k, r, start, &low) == ROLN_CLIPPED);
        }
}

/* What roln_fit_limits refuses; nothing is written. */
static void check_fit_refused(int k, const recordings *r, rig *start, const roln_batch *good_batch, const roln_limits *from)
{
    static recordings bad;
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    const roln_trained m = of_rig(k, start);
    roln_batch wrong[5], b = *good_batch;
    roln_real each[MAXN], rates[MAXN], B[MAXN] = {1};
    const roln_motors one = {1, B, 0};
    roln_limits l = *from;
    int i, t;
    fill(MAXN, 7, each), fill(MAXN, 7, rates);
#define REFUSED(batch, slack, status) \
    CHECK(roln_fit_limits(&m, batch, slack, &l, each, rates, ROOM(fit_limits)) == (status) && all(MAXN, each, 7) && \
          all(MAXN, rates, 7))
    for (i = 0; i < 5; i++)
        wrong[i] = b;
    wrong[0].count = 0, wrong[1].steps = -1, wrong[2].stride = 2, wrong[3].qd = NULL, wrong[4].steps = 0;
    for (i = 0; i < 5; i++)
        REFUSED(wrong + i, 1, ROLN_E_LENGTH);
    REFUSED(&b, ROLN_C(0.99), ROLN_E_RANGE);
    REFUSED(&b, (roln_real)NAN, ROLN_E_RANGE);
    REFUSED(&b, (roln_real)INFINITY, ROLN_E_NOT_FINITE); /* limits that are none */
    b.tau = NULL;
    REFUSED(&b, (roln_real)INFINITY, ROLN_E_NOT_FINITE);
    b.tau = good_batch->tau;
    for (i = 0; i < 3; i++) {
        bad = *r;
        (i == 0 ? bad.q : i == 1 ? bad.qd : bad.tau)[RUNS * TICKS * (i < 2 ? N : F) - 1] = (roln_real)NAN; /* the last number */
        b.q = bad.q, b.qd = bad.qd, b.tau = bad.tau;
        REFUSED(&b, 1, ROLN_E_NOT_FINITE);
    }
    for (i = 0, bad = *r; i < F; i++) { /* a torque that never changes has no limit of its rate; one that is 0 needs none */
        for (t = 0; t < RUNS * TICKS; t++)
            bad.tau[t * F + i] = 3;
        b.q = bad.q, b.qd = bad.qd, b.tau = bad.tau;
        REFUSED(&b, 1, ROLN_E_RANGE);
        for (t = 0; t < RUNS * TICKS; t++)
            bad.tau[t * F + i] = 0;
    }
    CHECK_OK(roln_fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    CHECK(all(F, each, 0) && all(F, rates, 0));
    fill(MAXN, 7, each), fill(MAXN, 7, rates), l = *from;
    b = *good_batch;
    fill(n, 0, start->z_min), fill(n, 0, start->z_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    fill(n, -99, start->z_min), fill(n, 99, start->z_max), fill(n, 0, start->zd_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    CHECK(memcmp(&l, from, sizeof l) == 0);
    l.dt = 0;
    REFUSED(&b, 1, ROLN_E_RANGE);
    l.dt = from->dt, l.window = -1;
    REFUSED(&b, 1, ROLN_E_RANGE);
    l = *from, l.tau = 0, b.tau = NULL; /* torques that nobody has told of */
    fill(n, 99, start->zd_max);
    REFUSED(&b, 1, ROLN_E_RANGE);
    if (m.model->inputs > 0) return;
    b.tau = good_batch->tau, l.motors = &one;
    REFUSED(&b, 1, ROLN_E_RANGE);
#undef REFUSED
}

/* What rests needs no range of velocities. */
static void check_fit_rest(int k, rig *start, const roln_batch *good_batch, const roln_limits *from)
{
    static roln_real rest[RUNS * TICKS * MAXN];
    const roln_trained m = of_rig(k, start);
    roln_batch b = *good_batch;
    roln_real each[MAXN], rates[MAXN];
    roln_limits l = *from;
    fill(n_OF(k), 0, start->zd_max), b.qd = rest;
    CHECK_OK(roln_fit_limits(&m, &b, 1, &l, each, rates, ROOM(fit_limits)));
    fill(n_OF(k), 99, start->zd_max);
}

static void test_fit_limits(int k)
{
    static recordings r;
    static rig start;
    const int n = n_OF(k), F = F_OF(k);
    const roln_real slack = 1 + 64 * ROLN_EPS, safe[MAXN] = {0};
    const roln_batch b = {RUNS, TICKS - 1, 1, NULL, r.q, r.qd, NULL, r.tau};
    roln_batch free_motion = b;
    roln_real each[MAXN], rates[MAXN], twice[MAXN], fast[MAXN];
    roln_limits l, l2, was;
    roln_trained m;
    int i;
    good(k, &start);
    record(k, &r);
    fill(n, ROLN_C(-0.25), start.z_min), fill(n, ROLN_C(0.25), start.z_max), fill(n, ROLN_C(0.25), start.zd_max);
    m = of_rig(k, &start);
    memset(&start.g, 0, sizeof start.g);
    memset(&l, 0, sizeof l);
    l.dt = ROLN_C(0.0625), l.window = 3, l.hold = 7, l.strict = 1, l.safe = safe, l.tau = 99, was = l;
    fill(MAXN, 7, each), fill(MAXN, 7, rates);
    CHECK_OK(roln_fit_limits(&m, &b, slack, &l, each, rates, ROOM(fit_limits)));
    ROOM_KEPT();
    CHECK(l.hold == 7 && l.window == 3 && l.strict == 1 && l.safe == safe && l.tau_each == each && l.rate_each == rates);
    CHECK(all(MAXN - F, each + F, 7) && all(MAXN - F, rates + F, 7));
    CHECK(largest(F, each) <= (ld)l.tau && largest(F, rates) <= (ld)l.rate && l.margin > ROLN_C(0.1));
    check_least(k, &r, &start, &l);
    fill(n, -99, start.z_min), fill(n, 99, start.z_max), fill(n, ROLN_C(0.0625), start.zd_max); /* velocities alone are beyond */
    l2 = was;
    CHECK_OK(roln_fit_limits(&m, &b, slack, &l2, twice, fast, ROOM(fit_limits)));
    CHECK(l2.margin > 1);
    check_least(k, &r, &start, &l2);
    fill(n, ROLN_C(-0.25), start.z_min), fill(n, ROLN_C(0.25), start.z_max), fill(n, ROLN_C(0.25), start.zd_max);
    l2 = was; /* slack is a factor of all */
    CHECK_OK(roln_fit_limits(&m, &b, 2 * slack, &l2, twice, fast, ROOM(fit_limits)));
    CHECK(all(1, &l2.power, 2 * l.power) && all(1, &l2.margin, 2 * l.margin) && all(1, &l2.q_off, 2 * l.q_off));
    CHECK(all(1, &l2.qd_off, 2 * l.qd_off) && all(1, &l2.tau, 2 * l.tau) && all(1, &l2.rate, 2 * l.rate));
    for (i = 0; i < F; i++)
        CHECK(all(1, twice + i, 2 * each[i]) && all(1, fast + i, 2 * rates[i]));
    /* a range that holds all still gets a tenth; without torques their limits stay */
    fill(n, -99, start.z_min), fill(n, 99, start.z_max), fill(n, 99, start.zd_max);
    free_motion.tau = NULL, l = was, fill(MAXN, 7, each);
    CHECK_OK(roln_fit_limits(&m, &free_motion, slack, &l, each, rates, ROOM(fit_limits)));
    CHECK(all(1, &l.margin, ROLN_C(0.1)) && all(1, &l.tau, 99) && !l.tau_each && !l.rate_each && all(MAXN, each, 7));
    l = was, l.tau_each = each, l.tau = (roln_real)NAN; /* which counts for nothing beside tau_each */
    CHECK_OK(roln_fit_limits(&m, &free_motion, slack, &l, twice, fast, ROOM(fit_limits)));
    CHECK(l.tau_each == each && all(1, &l.margin, ROLN_C(0.1)));
    check_fit_rest(k, &start, &b, &was);
    check_fit_refused(k, &r, &start, &b, &was);
}

#ifdef ROLN_DOUBLE
/* A motion of the model of half a second, tick by tick. */
typedef struct {
    double h, power; /* time of a tick; largest power of the forces that the guard does not know */
    int ticks;
    double z[300][MAXN], zd[300][MAXN], want[300][MAXN];
} motion;

/* push: a force on the joints that the guard does not know. */
static void move(int k, double h, double push, motion *x)
{
    const roln_model md = driven(k, ROLN_RK4);
    const roln_trained m = trained(&md, scale_of(k), theta_k);
    const int n = n_OF(k), F = F_OF(k), N = N_OF(k), inside = 20, inputs = models[k].md->inputs;
    double s[2 * MAXN], tau[MAXN], tau_z[MAXN], outside[MAXN];
    uint64_t seed = 320 + (uint64_t)k;
    int t, i, j, p;
    parameters(k, &seed, theta_k);
    dyadic(2 * n, ROLN_C(0.5), &seed, s), dyadic(N, push, &seed, outside);
    x->h = h, x->ticks = (int)(0.5 / h), x->power = 0;
    for (t = 0; t < x->ticks; t++) {
        double power = 0;
        for (i = 0; i < F; i++)
            x->want[t][i] = 0.5 * sin(3 * t * h + i);
        memcpy(x->z[t], s, sizeof *x->z), memcpy(x->zd[t], s + n, sizeof *x->zd);
        for (i = 0; i < N; i++) {
            tau[i] = outside[i] + (inputs ? 0 : x->want[t][i]);
            for (j = 0; j < inputs; j++)
                tau[i] += theta_k[models[k].params - N * F + i * F + j] * x->want[t][j];
        }
        CHECK_OK(roln_reduce(&m, x->z[t], outside, tau_z, spare));
        for (i = 0; i < n; i++)
            power += tau_z[i] * x->zd[t][i];
        x->power = fabs(power) > x->power ? fabs(power) : x->power;
        for (p = 0; p < inside; p++)
            CHECK_OK(roln_step(&m, s, s + n, tau, h / inside, spare));
    }
}

/* Does the energy check of a guard with this limit find anything in a motion? */
static int caught(int k, const motion *mo, double limit)
{
    static rig x;
    const int n = n_OF(k);
    int t;
    memset(&x, 0, sizeof x);
    fill(n, -9, x.z_min), fill(n, 9, x.z_max), fill(n, 99, x.zd_max);
    x.limits.dt = mo->h, x.limits.tau = 9, x.limits.power = limit, x.limits.hold = 1000;
    for (t = 0; t < mo->ticks; t++) {
        uint32_t f;
        memcpy(x.z, mo->z[t], sizeof x.z), memcpy(x.zd, mo->zd[t], sizeof x.zd), memcpy(x.want, mo->want[t], sizeof x.want);
        f = tick(k, &x);
        CHECK((f & ~(uint32_t)ROLN_FAULT_ENERGY) == 0);
        memcpy(x.held, mo->want[t], sizeof x.held); /* what the motors did: the model's own motion goes on */
        if (f) return 1;
    }
    return 0;
}

/* The smallest limit that passes a motion, by bisection. heavy: the guard's model has M e^heavy. */
static double residual(int k, double h, double push, double heavy, double *power)
{
    static motion mo;
    const roln_lnn *f = &models[k].md->lnn;
    double lo = 0, hi = 1e4;
    int i, it;
    move(k, h, push, &mo);
    *power = mo.power;
    for (i = 0; i < f->n && fabs(heavy) > 0; i++) /* U + heavy I */
        theta_k[roln_ae_params(&models[k].md->ae) + roln_mlp_params(&f->mass_net) - ROLN_TRI(f->n) + i] += heavy;
    CHECK(!caught(k, &mo, hi));
    for (it = 0; it < 44; it++) {
        const double mid = sqrt((lo + 1e-14) * hi);
        if (caught(k, &mo, mid)) lo = mid;
        else hi = mid;
    }
    return hi;
}

static void test_guard_energy(int k)
{
    double P, r[3], pushed, light, wrong;
    r[0] = residual(k, 1 / 64., 0, 0, &P);
    r[1] = residual(k, 1 / 128., 0, 0, &P);
    r[2] = residual(k, 1 / 256., 0, 0, &P);
    BOUND("guard, residual of a true motion, dt = 1/64", r[0], 1);
    BOUND("guard, residual, halved dt: 4 times", fabs(log2(r[0] / r[1]) - 2), 0.35);
    BOUND("guard, residual, halved again", fabs(log2(r[1] / r[2]) - 2), 0.35);
    pushed = residual(k, 1 / 256., 1, 0, &P); /* an external force of known power */
    BOUND("guard, power of an unknown force", fabs(pushed / P - 1), 0.08);
    CHECK(pushed > 20 * r[2]);
    light = residual(k, 1 / 256., -0.125, 0, &P);
    BOUND("guard, power of a small one", fabs(light / P - 1), 0.1);
    if (models[k].size.formed || models[k].size.base) return;
    wrong = residual(k, 1 / 256., 0, 0.4, &P);
    CHECK(wrong > 20 * r[2]);
#ifdef ROLN_TEST_VERBOSE
    printf("guard, model %d: residual %.2e %.2e %.2e W; pushed %.3f W; M off by half: %.3f W\n", k, r[0], r[1], r[2], pushed,
           wrong);
#endif
}

/* The largest residual of a guard that sees a motion through 12-bit encoders. */
static double encoder_residual(int k, double push, int window)
{
    static motion mo;
    static rig x;
    const double angle = 6.283185307179586 / 4096, h = 1 / 256., rate = angle / (8 * h);
    const int n = n_OF(k);
    double top = 0;
    int t, i;
    move(k, h, push, &mo);
    memset(&x, 0, sizeof x);
    fill(n, -99, x.z_min), fill(n, 99, x.z_max), fill(n, 99, x.zd_max);
    x.limits.dt = h, x.limits.tau = 9, x.limits.power = 1e30, x.limits.window = window;
    for (t = 0; t < mo.ticks; t++) {
        for (i = 0; i < n; i++)
            x.z[i] = angle * floor(mo.z[t][i] / angle + 0.5), x.zd[i] = rate * floor(mo.zd[t][i] / rate + 0.5);
        memcpy(x.want, mo.want[t], sizeof x.want);
        CHECK(tick(k, &x) == 0);
        top = fabs(x.g.residual) > top ? fabs(x.g.residual) : top;
    }
    return top;
}

/* Through encoders the residual of a single tick is mostly that of their steps; the mean over 32 is 25 times less, and a force that
   the model does not know stands out. */
static void test_guard_encoder(int k)
{
    const double push = 8 / scale_of(k)->q; /* as much in the units of the networks */
    const double one = encoder_residual(k, 0, 0), mean = encoder_residual(k, 0, 32), pushed = encoder_residual(k, push, 32);
    BOUND("guard, 12-bit encoders, mean over 32 ticks / one tick", mean / one, 1 / 25.);
    CHECK(pushed > 4 * mean);
#ifdef ROLN_TEST_VERBOSE
    printf("guard, model %d: residual through encoders %.2e, mean of 32 %.2e W; pushed %.3f W\n", k, one, mean, pushed);
#endif
}
#endif

/* ---- the shell -------------------------------------------------------------------------------- */

/* Scratch of a function in the union that the shell wants, and not a number more. */
#define RICH_WORK(member) ((rich_work *)(void *)room_of(NUMBERS_OF(rich_work, member)))
#define PLAIN_WORK(member) ((plain_work *)(void *)room_of(NUMBERS_OF(plain_work, member)))

/* The parameters and the state of a rig, typed. */
static void typed_rig(const rig *x, rich_params *p, rich_state *full, rich_latent *s)
{
    p->slope = rich_model.ae.slope, p->least = rich_model.lnn.least, p->scale = scale;
    memcpy(p->theta, theta_k, sizeof p->theta);
    memcpy(p->z_min, x->z_min, sizeof p->z_min), memcpy(p->z_max, x->z_max, sizeof p->z_max);
    memcpy(p->zd_max, x->zd_max, sizeof p->zd_max);
    memcpy(full->q, x->q, sizeof full->q), memcpy(full->qd, x->qd, sizeof full->qd);
    memcpy(s->z, x->z, sizeof s->z), memcpy(s->zd, x->zd, sizeof s->zd);
}

/* The shell is the generic functions with the model filled in. */
static void test_shell(void)
{
    static rich_params p;
    static rich_guard g;
    static rig x;
    rich_state full;
    rich_latent s, s1;
    rich_target r, r1;
    rich_jacobian jac, jac1;
    roln_target ref;
    roln_trained m;
    roln_real v[6], y[6], y1[6], zd2[3], a[3], motors[6 * 4], u[5], u1[5];
    roln_motors four = {4, motors, ROLN_C(0.5)};
    uint64_t seed = 330;
    good(RICH, &x);
    typed_rig(&x, &p, &full, &s);
    m = rich_trained(&p);
    dyadic(6, 1, &seed, v), dyadic(3, 1, &seed, zd2), dyadic(3, 1, &seed, r.kp), dyadic(3, 1, &seed, r.kd),
        dyadic(24, 1, &seed, motors);
    r1 = r;
    CHECK_OK(rich_aim(&p, full.q, full.qd, v, &r, RICH_WORK(aim)));
    ROOM_KEPT();
    CHECK_OK(roln_encode(&m, full.q, full.qd, v, r1.z, r1.zd, r1.zdd, spare));
    CHECK(memcmp(&r, &r1, sizeof r) == 0); /* the gains as they were */
    CHECK_OK(rich_inverse(&p, &s, zd2, r.kp, a, RICH_WORK(inverse)));
    CHECK(roln_inverse(&m, s.z, s.zd, zd2, r.kp, y1, spare) == ROLN_OK && same(3, a, y1));
    CHECK_OK(rich_control(&p, &s, &r, a, RICH_WORK(control)));
    ref.z = r.z, ref.zd = r.zd, ref.zdd = r.zdd, ref.kp = r.kp, ref.kd = r.kd, ref.load = NULL;
    CHECK(roln_control(&m, s.z, s.zd, &ref, y1, spare) == ROLN_OK && same(3, a, y1));
    CHECK_OK(rich_inertia(&p, &s, v, y, RICH_WORK(inertia)));
    CHECK(roln_inertia(&m, s.z, v, y1, spare) == ROLN_OK && same(6, y, y1));
    CHECK_OK(rich_allocate(&p, &s, &four, zd2, u, u + 4, RICH_WORK(allocate)));
    CHECK(roln_allocate(&m, s.z, &four, zd2, u1, u1 + 4, spare) == ROLN_OK && same(5, u, u1));
    four.count = 2, four.B = p.theta + rich_theta_size - 12; /* what it has learned */
    CHECK_OK(roln_allocate(&m, s.z, &four, zd2, u1, u1 + 4, spare));
    four.count = 7, four.B = NULL;
    CHECK(rich_allocate(&p, &s, &four, zd2, u, u + 4, RICH_WORK(allocate)) == ROLN_OK && same(2, u, u1) && same(1, u + 4, u1 + 4));
    s1 = s;
    CHECK_OK(rich_linear(&p, &s1, v, dt, &jac, (rich_linwork *)(void *)room_of(NUMBERS_OF(rich_linwork, linear))));
    ROOM_KEPT();
    s1 = s;
    CHECK_OK(roln_linear(&m, s1.z, s1.zd, v, dt, jac1.A, jac1.B, spare));
    CHECK(same(36, jac.A, jac1.A) && same(12, jac.B, jac1.B));
    memset(&g, 0, sizeof g);
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == 0 && same(2, g.tau, x.want));
    ROOM_KEPT();
    full.qd[5] = (roln_real)NAN; /* the last number counts */
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_INPUT);
    CHECK(same(2, g.tau, x.want) && g.g.bad == 1);
    full.qd[5] = 0, p.zd_max[2] = -1;
    CHECK(rich_guard_tick(&p, &x.limits, &full, &s, x.want, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_RANGE);
    CHECK(g.g.faults == (ROLN_FAULT_INPUT | ROLN_FAULT_RANGE));
    CHECK(rich_guard_tick(&p, &x.limits, &full, NULL, NULL, &g, RICH_WORK(guard_tick)) == ROLN_FAULT_STATUS &&
          same(2, g.tau, x.want));
}

/* NAME_tick, too: a first tick with NaN leaves s, one without follows. */
static void test_shell_tick(void)
{
    static plain_params p;
    static plain_guard g;
    static plain_start start;
    const roln_limits limits = {.dt = dt, .tau = 1000, .hold = 2};
    plain_state x = {{0, 0, 0, 0, 0, (roln_real)NAN}, {0}};
    plain_target r = {{0}, {0}, {0}, {1, 1}, {1, 1}};
    plain_latent s, was;
    uint64_t seed = 331;
    CHECK_OK(plain_init(&p, &seed, &start));
    fill(2, -9, p.z_min), fill(2, 9, p.z_max), fill(2, 9, p.zd_max);
    memset(&s, 0xa5, sizeof s), memset(&was, 0xa5, sizeof was);
    CHECK(plain_tick(&p, &limits, &x, &r, &s, &g, PLAIN_WORK(tick)) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS));
    ROOM_KEPT();
    CHECK(memcmp(&s, &was, sizeof s) == 0 && all(6, g.tau, 0) && g.g.bad == 1);
    x.q[5] = ROLN_C(0.25);
    CHECK(plain_tick(&p, &limits, &x, &r, &s, &g, PLAIN_WORK(tick)) == 0 && largest(6, g.tau) > 0 && g.g.bad == 0);
    CHECK(plain_in_range(&p, &s));
}

/* Numbers of another config: everything is refused, and nothing is written. */
static void refused(plain_params *p)
{
    static struct {
        plain_state x;
        plain_latent s;
        plain_target r;
        plain_equation e;
        plain_jacobian j;
        roln_real tau_z[2], tau[6];
    } to, was;
    static plain_linwork linwork;
    static plain_guard g;
    const roln_limits limits = {.dt = dt, .tau = 1000, .hold = 2};
    const plain_params before = *p;
    const plain_state x = {{0}, {0}};
    const plain_latent s = {{0}, {0}}, along[2] = {{{0}, {0}}, {{0}, {0}}};
    const plain_target r = {{0}, {0}, {0}, {1, 1}, {1, 1}};
    const roln_real v[36] = {0};
    const roln_motors motors = {1, v, 1};
    const roln_cost cost = {v, v, v, dt, &motors};
    static plain_lqrwork lqrwork;
    const int one = 0;
    memset(&to, 0xa5, sizeof to), was = to;
    memset(&g, 0, sizeof g);
    CHECK(plain_encode(p, &x, &to.s, PLAIN_WORK(encode)) == ROLN_E_SHAPE);
    CHECK(plain_decode(p, &s, &to.x, PLAIN_WORK(decode)) == ROLN_E_SHAPE);
    CHECK(plain_decode_some(p, &s, 1, &one, to.x.q, to.x.qd, PLAIN_WORK(decode_some)) == ROLN_E_SHAPE);
    CHECK(plain_aim(p, v, v, v, &to.r, PLAIN_WORK(aim)) == ROLN_E_SHAPE);
    CHECK(plain_control(p, &s, &r, to.tau_z, PLAIN_WORK(control)) == ROLN_E_SHAPE);
    CHECK(plain_lift(p, &s, v, to.tau, PLAIN_WORK(lift)) == ROLN_E_SHAPE);
    CHECK(plain_gains(p, &s, v, v, &to.r, PLAIN_WORK(gains)) == ROLN_E_SHAPE);
    CHECK(plain_lqr(p, &cost, &s, NULL, to.tau, NULL, &lqrwork) == ROLN_E_SHAPE);
    CHECK(plain_lqr_along(p, &cost, 1, along, NULL, NULL, to.tau, &lqrwork) == ROLN_E_SHAPE);
    CHECK(plain_allocate(p, &s, &motors, v, to.tau, NULL, PLAIN_WORK(allocate)) == ROLN_E_SHAPE);
    CHECK(plain_step(p, &to.s, NULL, dt, PLAIN_WORK(step)) == ROLN_E_SHAPE);
    CHECK(plain_linear(p, &to.s, NULL, dt, &to.j, &linwork) == ROLN_E_SHAPE);
    CHECK(plain_reduce(p, &s, v, to.tau_z, PLAIN_WORK(reduce)) == ROLN_E_SHAPE);
    CHECK(plain_inverse(p, &s, NULL, v, to.tau_z, PLAIN_WORK(inverse)) == ROLN_E_SHAPE);
    CHECK(plain_terms(p, &s, &to.e, PLAIN_WORK(terms)) == ROLN_E_SHAPE);
    CHECK(plain_inertia(p, &s, v, to.tau, PLAIN_WORK(inertia)) == ROLN_E_SHAPE);
    CHECK(plain_fit_range(p, 1, v, v, PLAIN_WORK(fit_range)) == ROLN_E_SHAPE);
    CHECK(!plain_in_range(p, &s));
    CHECK(plain_guard_tick(p, &limits, &x, &s, v, &g, PLAIN_WORK(guard_tick)) == ROLN_FAULT_STATUS && g.g.bad == 1);
    CHECK(plain_tick(p, &limits, &x, &r, &to.s, &g, PLAIN_WORK(tick)) == ROLN_FAULT_STATUS && g.g.bad == 2);
    CHECK(memcmp(&to, &was, sizeof to) == 0 && memcmp(p, &before, sizeof before) == 0 && all(6, g.tau, 0));
}

static void test_foreign(void)
{
    static plain_params p, zero;
    static plain_start start;
    uint64_t seed = 332;
    CHECK_OK(plain_init(&p, &seed, &start));
    fill(2, -9, p.z_min), fill(2, 9, p.z_max), fill(2, 9, p.zd_max);
    p.slope *= 1 + ROLN_EPS, refused(&p), p.slope = plain_model.ae.slope;
    p.least /= 2, refused(&p), p.least = (roln_real)NAN, refused(&p);
    refused(&zero);
}

/* Units can overflow where the network's own numbers do not: never infinity with ROLN_OK. */
static void test_overflow(void)
{
    const roln_scale tiny = {1, PICK(ROLN_C(0.0009765625), 9.5367431640625e-7), 1};
    const roln_model md = driven(DELAN, ROLN_EULER);
    const roln_trained m = trained(&md, &tiny, theta_k);
    roln_real z[2], zd[2], tau[4], A[16], B[16];
    uint64_t s = 340;
    int e;
    parameters(DELAN, &s, theta_k);
    for (e = 0; e < (int)(8 * sizeof(roln_real)); e++) {
        fill(4, PICK(1e30f, 1e290) * (roln_real)(1 << (e % 30)) * (e >= 30 ? ROLN_C(1e9) : 1), tau);
        fill(2, 0, z), fill(2, 0, zd);
        if (roln_step(&m, z, zd, tau, 8, spare) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
        fill(2, 0, z), fill(2, 0, zd);
        if (roln_linear(&m, z, zd, tau, 8, A, B, spare) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
    }
}

/* Levels of friction that no number holds: refused, c and v untouched. */
static void test_friction_of(void)
{
    static wheel_params p;
    static wheel_start start;
    roln_real c[wheel_n], v[wheel_n], *logs = p.theta + roln_ae_params(&wheel_model.ae) + rolni_friction_at(&wheel_model.lnn);
    uint64_t seed = 341;
    int i;
    CHECK_OK(wheel_init(&p, &seed, &start));
    CHECK_OK(wheel_friction_of(&p, c, v));
    for (i = 0; i < 2 * wheel_n; i++) {
        const roln_real was = logs[i];
        logs[i] = i % 2 ? (roln_real)NAN : 1000;
        fill(wheel_n, 7, c), fill(wheel_n, 7, v);
        CHECK(wheel_friction_of(&p, c, v) == ROLN_E_NOT_FINITE && all(wheel_n, c, 7) && all(wheel_n, v, 7));
        logs[i] = was;
    }
    p.slope = 0;
    CHECK(wheel_friction_of(&p, c, v) == ROLN_E_SHAPE && all(wheel_n, c, 7));
}

void TEST_NAME(control)(void)
{
    int k;
#ifndef ROLN_DOUBLE
    test_light_states();
#endif
    test_weights_of_ends();
    for (k = 0; k < MODELS; k++) {
        test_calls(k);
        test_motion(k);
        test_linear_calls(k);
        test_lift(k);
        test_allocate(k);
        test_near_motors(k);
        test_gains(k);
        test_lqr(k, 0);
        test_lqr(k, 1);
#ifdef ROLN_DOUBLE
        test_jet(k);
        test_inverse(k);
        test_power(k);
        test_inertia(k);
        test_linear(k);
        test_closed_loop(k);
        test_guard_energy(k);
        test_guard_encoder(k);
#endif
        test_guard_patterns(k);
        test_guard_held(k);
        test_guard_unknown(k);
        test_guard_manifold(k);
        test_guard_counters(k);
        test_guard_hold(k);
        test_guard_range(k);
        test_guard_clip(k);
        test_guard_clip_patterns(k);
        test_guard_limits(k);
        test_guard_safe(k);
        test_guard_window(k);
        test_fit_limits(k);
        test_tick(k, 0);
        test_tick(k, 1);
        test_guard_motors(k);
        test_first_tick(k);
    }
    test_fault_bits();
    test_turns();
    test_shell();
    test_shell_tick();
    test_foreign();
    test_overflow();
    test_friction_of();
    print_bounds();
}
