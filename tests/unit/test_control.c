/* SPDX-License-Identifier: MIT */
/* Mechanics and control in the latent space (roln.h, runs in firmware): units and failures of every call, jets, inverse dynamics,
   power, apparent inertia, PD+ control in a closed loop, what overflows. */

/* Those with learned inputs, driven by torques of the joints. */
#define CALLED(X) X(reduce)
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_driven
#define SMALL_INPUTS(count) 0
#include "small_models.h"

#ifdef ROLN_DOUBLE
/* All of them with the integrator that errs least. */
#undef CALLED
#define CALLED(X) X(reduce) X(step) X(dynamics)
#define SMALL(name) name##_rk4
#define SMALL_STEP(scheme) rk4
#include "small_models.h"
#endif

#undef CALLED
#define CALLED(X) \
    X(encode) X(encode_reference) X(decode) X(step) X(reduce) X(lift) X(dynamics) X(fit_range) X(inverse) X(inertia) X(linear) \
    X(control) X(allocate)
#include "small.h"
#include "control.h"

void TEST_NAME(control)(void);

#define DRIVEN_CALLED(name) name##_driven_called
static const model *const driven[MODELS] = SMALL_TABLE(SMALL_CALLED, DRIVEN_CALLED);
#ifdef ROLN_DOUBLE
#define RK4_CALLED(name) name##_rk4_called
static const model *const by_rk4[MODELS] = SMALL_TABLE(RK4_CALLED, RK4_CALLED);
#endif

/* ---- every call: units, work, failures -------------------------------------------------------- */

enum { ENCODE, DECODE, STEP, REDUCE, LIFT, TERMS_AT, RANGE, JET, INVERSE, INERTIA, LINEAR, CONTROL, ALLOCATE, FIT, CALLS };
enum { MOTORS = 2, MAXIN = 128, MAXOUT = 256, PARTS = 8 };

static const char *const call_names[CALLS] = {
    [ENCODE] = "encode",   [DECODE] = "decode",   [STEP] = "step",       [REDUCE] = "reduce", [LIFT] = "lift",
    [TERMS_AT] = "dynamics", [RANGE] = "fit_range", [JET] = "encode_reference", [INVERSE] = "inverse", [INERTIA] = "inertia",
    [LINEAR] = "linear",   [CONTROL] = "control", [ALLOCATE] = "allocate", [FIT] = "fit_scale"};

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
        [ENCODE] = {.in = {{.count = N, .q = 1}, {.count = N, .q = 1, .t = -1}}, .out = {{.count = n}, {.count = n, .t = -1}}},
        [DECODE] = {.in = {{.count = n}, {.count = n, .t = -1}}, .out = {{.count = N, .q = 1}, {.count = N, .q = 1, .t = -1}}},
        [STEP] = {.in = {{.count = n}, {.count = n, .t = -1}, {.count = F, .q = -1, .t = -2, .m = 1}, {.count = 1, .t = 1}},
                  .out = {{.count = n}, {.count = n, .t = -1}}},
        [REDUCE] = {.in = {{.count = n}, {.count = F, .q = -1}}, .out = {{.count = n}}},
        [LIFT] = {.in = {{.count = n}, {.count = n, .q = 1}}, .out = {{.count = N}}},
        [TERMS_AT] = {.in = {{.count = n}, {.count = n, .t = -1}},
                      .out = {{.count = n * n, .m = 1}, {.count = 3 * n + 2, .t = -2, .m = 1}}},
        [RANGE] = {.in = {{.count = 3 * N, .q = 1}, {.count = 3 * N, .q = 1, .t = -1}},
                   .out = {{.count = 2 * n}, {.count = n, .t = -1}}},
        [JET] = {.in = {{.count = N, .q = 1}, {.count = N, .q = 1, .t = -1}, {.count = N, .q = 1, .t = -2}},
                 .out = {{.count = n}, {.count = n, .t = -1}, {.count = n, .t = -2}}},
        [INVERSE] = {.in = {{.count = n}, {.count = 2 * n, .t = -1}, {.count = n, .t = -2}},
                     .out = {{.count = n, .t = -2, .m = 1}}},
        [INERTIA] = {.in = {{.count = n}, {.count = N, .q = 1}}, .out = {{.count = N, .q = -1, .m = 1}}},
        [LINEAR] = {.in = {{.count = n}, {.count = n, .t = -1}, {.count = F, .q = -1, .t = -2, .m = 1}, {.count = 1, .t = 1}},
                    .out = {{.count = n}, {.count = n, .t = -1}}}, /* and A, B: linear_unit */
        [CONTROL] = {.in = {{.count = n},
                            {.count = n, .t = -1},
                            {.count = n},
                            {.count = n, .t = -1},
                            {.count = n, .t = -2},
                            {.count = n, .t = -2, .m = 1},
                            {.count = n, .t = -1, .m = 1}},
                     .out = {{.count = n, .t = -2, .m = 1}}},
        [ALLOCATE] = {.in = {{.count = 2 * n + 1}, {.count = N * MOTORS, .q = -1}}, .out = {{.count = MOTORS + 1}}},
        [FIT] = {.in = {{.count = 6 * N}}, .out = {{.count = N + 2}}},
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

/* Units of what NAME_linear gives beside the state: A [2n][2n], B [2n][F], row by row. */
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
static roln_status call(int which, int k, const instance *m, const roln_real *in, roln_real *out)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), nn = n * n;
    const target_at ref = {in + 2 * n, in + 3 * n, in + 4 * n, in + 5 * n, in + 6 * n, NULL};
    const roln_motors motors = {.count = MOTORS, .B = in + 2 * n + 1, .mu = in[2 * n]};
    const terms_at terms = {out, out + nn, out + nn + n, out + nn + 2 * n, out + nn + 3 * n, out + nn + 3 * n + 1};
    roln_real s[2 * MAXN];
    roln_scale fit = unit;
    roln_status st = ROLN_OK;
    memcpy(s, in, (size_t)(2 * n) * sizeof *s);
    switch (which) {
    case ENCODE: st = m->of->encode(m, in, in + N, out, out + n, ROOM(encode)); break;
    case DECODE: st = m->of->decode(m, in, in + n, out, out + N, ROOM(decode)); break;
    case STEP: st = m->of->step(m, s, s + n, in + 2 * n, in[2 * n + F], ROOM(step)); break;
    case REDUCE: st = m->of->reduce(m, in, in + n, out, ROOM(reduce)); break;
    case LIFT: st = m->of->lift(m, in, in + n, out, ROOM(lift)); break;
    case TERMS_AT: st = m->of->dynamics(m, in, in + n, &terms, ROOM(dynamics)); break;
    case RANGE: st = m->of->fit_range(m, 3, in, in + 3 * N, out, out + n, out + 2 * n, ROOM(fit_range)); break;
    case JET: st = m->of->encode_reference(m, in, in + N, in + 2 * N, out, out + n, out + 2 * n, ROOM(encode_reference)); break;
    case INVERSE: st = m->of->inverse(m, in, in + n, in + 2 * n, in + 3 * n, out, ROOM(inverse)); break;
    case INERTIA: st = m->of->inertia(m, in, in + n, out, ROOM(inertia)); break;
    case LINEAR: st = m->of->linear(m, s, s + n, in + 2 * n, in[2 * n + F], out + 2 * n, out + 2 * n + 4 * nn, ROOM(linear)); break;
    case CONTROL: st = m->of->control(m, in, in + n, &ref, out, ROOM(control)); break;
    case ALLOCATE: st = m->of->allocate(m, in, &motors, in + n, out, out + MOTORS, ROOM(allocate)); break;
    default:
        room_of(0);
        st = roln_fit_scale(m->of->md, 3, in, in + 3 * N, out, &fit, NULL);
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
    const instance plainly = trained(models[k], &unit, theta_k);
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
    if (!CHECK(wrong == 0)) printf("    %s_%s: units\n", models[k]->name, call_names[which]);
}

/* NaN, infinity and the edges of the range in every input: what comes out is finite, or nothing. */
static void check_edges(int which, int k, roln_real *in)
{
    const roln_real top = PICK(3.4028234e38f, 1.7976931348623157e308);
    const roln_real edge[8] = {
        (roln_real)NAN,     (roln_real)INFINITY, -(roln_real)INFINITY, top, -top, PICK(1e-45f, 4.9406564584124654e-324),
        PICK(1e19f, 1e154), PICK(-3e37f, -3e307)};
    const instance m = of_model(k);
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
            if (!CHECK(ok)) printf("    %s_%s, input %d, value %d\n", models[k]->name, call_names[which], i, b);
            in[i] = was;
        }
}

/* A scale that is NaN, where it is used. */
static void check_scales(int which, int k, const roln_real *in)
{
    static const int uses_q[CALLS] = {[ENCODE] = 1, [DECODE] = 1, [REDUCE] = 1, [LIFT] = 1,   [RANGE] = 1,
                                      [JET] = 1,    [INERTIA] = 1, [LINEAR] = 1, [ALLOCATE] = 1},
                     uses_t[CALLS] = {[STEP] = 1, [TERMS_AT] = 1, [INVERSE] = 1, [LINEAR] = 1, [CONTROL] = 1},
                     uses_m[CALLS] = {[STEP] = 1, [TERMS_AT] = 1, [INVERSE] = 1, [INERTIA] = 1, [LINEAR] = 1, [CONTROL] = 1};
    const roln_scale bad_q = {(roln_real)NAN, scale.t, 1}, bad_t = {scale.q, (roln_real)NAN, 1};
    const roln_scale bad_m = {scale.q, scale.t, (roln_real)NAN};
    const instance with_q = trained(models[k], &bad_q, theta_k), with_t = trained(models[k], &bad_t, theta_k);
    const instance with_m = trained(models[k], &bad_m, theta_k);
    roln_real out[MAXOUT];
    if (uses_q[which]) CHECK(call(which, k, &with_q, in, out) != ROLN_OK);
    if (uses_t[which]) CHECK(call(which, k, &with_t, in, out) != ROLN_OK);
    if (uses_m[which]) CHECK(call(which, k, &with_m, in, out) != ROLN_OK);
}

static void test_calls(int k)
{
    static roln_real in[MAXIN], out[MAXOUT];
    const roln_scale heavy = {scale_of(k)->q, scale_of(k)->t, 4};
    const instance m = trained(models[k], &heavy, theta_k);
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
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), inputs = models[k]->md->inputs;
    const ld h = powl(2, PICK(-8, -20));
    roln_real z[MAXN], zd[MAXN], z1[MAXN], zd1[MAXN], M[64],
        c[MAXN], g[MAXN], d[MAXN], T = 0, V = 0, in[MAXN], tau_z[MAXN], q[MAXN],
        qd[MAXN];
    const terms_at terms = {M, c, g, d, &T, &V};
    ld zdd[MAXN], top = 0, kinetic = 0, power = 0, power_z = 0, size = 0;
    uint64_t s = 1050 + (uint64_t)k;
    int i, j;
    parameters(k, &s, theta_k);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(N, 1, &s, in);
    memcpy(z1, z, sizeof z), memcpy(zd1, zd, sizeof zd);
    CHECK_OK(m.of->dynamics(&m, z, zd, &terms, ROOM(dynamics)));
    CHECK_OK(m.of->reduce(&m, z, in, tau_z, ROOM(reduce)));
    CHECK_OK(m.of->step(&m, z1, zd1, in, (roln_real)h, ROOM(step)));
    CHECK_OK(m.of->decode(&m, z, zd, q, qd, ROOM(decode)));
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
            tau += theta_k[models[k]->params - N * F + i * F + j] * in[j];
        power += (ld)tau * (ld)qd[i], size += fabsl((ld)tau * (ld)qd[i]);
    }
    CHECK_NEAR(power_z / size, power / size, 20 * EPS);
}

/* ---- mechanics -------------------------------------------------------------------------------- */

#ifdef ROLN_DOUBLE

/* zdd of the 3-jet: zd along the parabola q + qd t + qdd t^2 / 2. */
static void test_jet(int k)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    double q[MAXN], qd[MAXN], qdd[MAXN], x[MAXN], xd[MAXN], z[MAXN], zd[MAXN], zdd[MAXN], zs[4][MAXN], zds[4][MAXN], top;
    const double h = 2e-4;
    uint64_t s = 200 + (uint64_t)k;
    int i, j;
    parameters(k, &s, theta_k);
    dyadic(N, 1, &s, q), dyadic(N, 1, &s, qd), dyadic(N, 1, &s, qdd);
    CHECK_OK(m.of->encode_reference(&m, q, qd, qdd, z, zd, zdd, ROOM(encode_reference)));
    for (j = 0; j < 4; j++) {
        const double t = shift[j] * h;
        for (i = 0; i < N; i++) {
            x[i] = q[i] + t * qd[i] + t * t / 2 * qdd[i];
            xd[i] = qd[i] + t * qdd[i];
        }
        CHECK_OK(m.of->encode(&m, x, xd, zs[j], zds[j], ROOM(encode)));
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
    const instance m = of_model(k);
    const terms_at terms = {M, NULL, g, d, NULL, NULL};
    const double h = 2e-3;
    const int n = n_OF(k);
    double x[MAXN];
    int i, j, l;
    for (l = 0; l < n; l++) {
        for (j = 0; j < 4; j++) {
            const terms_at moved = {v[l][j], NULL, NULL, NULL, NULL, NULL};
            memcpy(x, z, (size_t)n * sizeof *x);
            x[l] += shift[j] * h;
            CHECK_OK(m.of->dynamics(&m, x, zd, &moved, ROOM(dynamics)));
        }
        for (i = 0; i < n * n; i++)
            dM[l][i] = SLOPE(v[l], i, h);
    }
    CHECK_OK(m.of->dynamics(&m, z, zd, &terms, ROOM(dynamics)));
    for (i = 0; i < n; i++)
        for (c[i] = 0, j = 0; j < n; j++)
            for (l = 0; l < n; l++)
                c[i] += (dM[l][i * n + j] + dM[j][i * n + l] - dM[i][j * n + l]) * zd[l] * w[j] / 2;
}

/* NAME_inverse with a velocity w and with zd, NAME_control, against those terms. */
static void test_inverse(int k)
{
    enum { WITH_W, WITH_ZD, PD, WAYS };
    const instance m = of_model(k);
    const int n = n_OF(k);
    double z[MAXN], zd[MAXN], w[MAXN], a[MAXN], kp[MAXN], kd[MAXN], zr[MAXN], M[64], c[MAXN], g[MAXN], d[MAXN], out[MAXN], top = 0;
    const target_at ref = {zr, w, a, kp, kd, NULL};
    uint64_t s = 210 + (uint64_t)k;
    int i, j, way;
    parameters(k, &s, theta_k);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(n, 1, &s, w), dyadic(n, 1, &s, a);
    dyadic(n, 1, &s, kp), dyadic(n, 1, &s, kd), dyadic(n, 1, &s, zr);
    for (way = 0; way < WAYS; way++) {
        slow_coriolis(k, z, zd, way == WITH_ZD ? zd : w, M, c, g, d);
        if (way == PD) CHECK_OK(m.of->control(&m, z, zd, &ref, out, ROOM(control)));
        else CHECK_OK(m.of->inverse(&m, z, zd, way == WITH_ZD ? NULL : w, a, out, ROOM(inverse)));
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
static double power_error(int k, const instance *m, const double *z0, const double *zd0, const double *tau, int steps)
{
    const int n = n_OF(k);
    const double h = 0.4 / steps;
    double z[MAXN], zd[MAXN], tau_z[MAXN], d[MAXN], T = 0, V = 0, gained = 0, work = 0, moved = 0;
    const terms_at terms = {NULL, NULL, NULL, d, &T, &V};
    int p, i;
    memcpy(z, z0, sizeof z), memcpy(zd, zd0, sizeof zd);
    for (p = 0; p <= steps; p++) {
        double power = 0;
        CHECK_OK(m->of->dynamics(m, z, zd, &terms, spare));
        CHECK_OK(m->of->reduce(m, z, tau, tau_z, spare));
        for (i = 0; i < n; i++)
            power += zd[i] * (tau_z[i] - d[i]);
        if (p == 0) gained -= T + V;
        if (p == steps) gained += T + V;
        work += h * power * (p == 0 || p == steps ? 1 : p % 2 ? 4 : 2) / 3;
        moved += h * fabs(power);
        if (p < steps) CHECK_OK(m->of->step(m, z, zd, tau, h, spare));
    }
    return fabs(gained - work) / moved;
}

/* The error of the balance falls with the fourth power of the step. */
static void test_power(int k)
{
    const instance m = trained(by_rk4[k], scale_of(k), theta_k);
    double z[MAXN], zd[MAXN], tau[MAXN], e[2];
    uint64_t s = 220 + (uint64_t)k;
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
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    double z[MAXN], zd[MAXN], q[MAXN], qd[MAXN], M[64], v[MAXN], y[MAXN], one[MAXN], column[MAXN], T = 0, top = 0, e;
    const terms_at terms = {M, NULL, NULL, NULL, &T, NULL};
    uint64_t s = 230 + (uint64_t)k;
    int i, j, a, b;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd);
    CHECK_OK(m.of->decode(&m, z, zd, q, qd, ROOM(decode)));
    CHECK_OK(m.of->dynamics(&m, z, zd, &terms, ROOM(dynamics)));
    for (j = 0; j < N; j++) {
        fill(MAXN, 0, one), one[j] = 1;
        CHECK_OK(m.of->encode(&m, q, one, y, column, ROOM(encode)));
        for (a = 0; a < n; a++)
            D[a * N + j] = column[a];
        CHECK_OK(m.of->inertia(&m, z, one, one, ROOM(inertia))); /* in place */
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
    CHECK_OK(m.of->inertia(&m, z, qd, y, ROOM(inertia)));
    for (e = 0, i = 0; i < N; i++)
        e += qd[i] * y[i] / 2;
    BOUND("inertia, 1/2 qd^T y = T, eps", fabs(e / T - 1) / EPS, k == DEEP ? 1e6 : 500);
    check_rank(N, n, Y);
    dyadic(N, 1, &s, v); /* D v = 0: no inertia */
    CHECK_OK(m.of->encode(&m, q, v, column, zd, ROOM(encode)));
    CHECK_OK(m.of->decode(&m, z, zd, q, qd, ROOM(decode)));
    for (i = 0; i < N; i++)
        v[i] -= qd[i];
    CHECK_OK(m.of->inertia(&m, z, v, y, ROOM(inertia)));
    for (i = 0; i < N; i++)
        BOUND("inertia off the manifold, eps", fabs(y[i]) / top / EPS, k == DEEP ? 1e5 : 500);
}

/* Closed loop on the model itself, at s and time t: W = 1/2 ed^T M ed + 1/2 e^T Kp e; *rate = -ed^T Kd ed, sd [2n] the motion. */
static double lyapunov(int k, const double *s, double t, const double *kp, const double *kd, double *rate, double *sd)
{
    const instance m = of_model(k);
    const int n = n_OF(k);
    double r[MAXN], rd[MAXN], rdd[MAXN], M[64], c[MAXN], g[MAXN], d[MAXN], tau_z[MAXN], x[MAXN], W = 0;
    const terms_at terms = {M, c, g, d, NULL, NULL};
    const target_at ref = {r, rd, rdd, kp, kd, NULL};
    int i, j;
    for (i = 0; i < n; i++) {
        r[i] = 0.3 * sin(t + i);
        rd[i] = 0.3 * cos(t + i);
        rdd[i] = -0.3 * sin(t + i);
    }
    CHECK_OK(m.of->control(&m, s, s + n, &ref, tau_z, ROOM(control)));
    CHECK_OK(m.of->dynamics(&m, s, s + n, &terms, ROOM(dynamics)));
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
    const double h = models[k]->md->lnn.squares > 0 ? 0.0025 : 0.005; /* a light mass moves fast */
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
    BOUND("closed loop, W at the end", W[STEPS - 1] / W[0], 1e-4);
}
#endif

/* J^T (D^T tau_z) = tau_z where the autoencoder is true. */
static void test_lift(int k)
{
    const instance m = of_model(k), by_joints = trained(driven[k], scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real z[MAXN], tau_z[MAXN], tau[MAXN], back[MAXN];
    uint64_t s = 280 + (uint64_t)k;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, tau_z);
    CHECK_OK(m.of->lift(&m, z, tau_z, tau, ROOM(lift)));
    CHECK_OK(by_joints.of->reduce(&by_joints, z, tau, back, spare));
    BOUND("reduce(lift), eps", furthest(n, back, tau_z) / EPS, k == DEEP ? 1e7L : 200); /* eight layers: D, J of size 1e3 */
}

/* Units can overflow where the network's own numbers do not: never infinity with ROLN_OK. */
static void test_overflow(void)
{
    const roln_scale tiny = {1, PICK(ROLN_C(0.0009765625), 9.5367431640625e-7), 1};
    const instance m = trained(&delan_called, &tiny, theta_k); /* euler */
    roln_real z[2], zd[2], tau[4], A[16], B[16];
    uint64_t s = 340;
    int e;
    parameters(DELAN, &s, theta_k);
    for (e = 0; e < (int)(8 * sizeof(roln_real)); e++) {
        fill(4, PICK(1e30f, 1e290) * (roln_real)(1 << (e % 30)) * (e >= 30 ? ROLN_C(1e9) : 1), tau);
        fill(2, 0, z), fill(2, 0, zd);
        if (m.of->step(&m, z, zd, tau, 8, spare) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
        fill(2, 0, z), fill(2, 0, zd);
        if (m.of->linear(&m, z, zd, tau, 8, A, B, spare) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
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
    CHECK_OK(wheel_init(&p, &seed, &start.init));
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

/* All numbers of the law, in units: they give the friction of NAME_dynamics, and are refused as those of friction_of. */
static void test_friction_law(void)
{
    static rubbed_params p;
    static rubbed_start start;
    static rubbed_dynamics_work work;
    roln_friction law[rubbed_n], kept[rubbed_n];
    roln_real c[rubbed_n], v[rubbed_n], *at = p.theta + rolni_friction_at(&rubbed_model.lnn);
    const rubbed_latent s = {{ROLN_C(0.3), ROLN_C(-0.2), ROLN_C(0.6)}, {ROLN_C(0.7), ROLN_C(-0.4), ROLN_C(2.0)}};
    rubbed_equation e[2];
    uint64_t seed = 342;
    int i;
    CHECK_OK(rubbed_init(&p, &seed, &start.init));
    p.scale.t = ROLN_C(0.5), p.scale.m = 3;
    for (i = 0; i < 6 * rubbed_n; i++) at[i] += roln_normal(&seed);
    CHECK_OK(rubbed_friction_of(&p, c, v));
    CHECK_OK(rubbed_friction_law(&p, law));
    CHECK_OK(rubbed_dynamics(&p, &s, e, &work));
    for (i = 0; i < rubbed_n; i++) at[i] = at[2 * rubbed_n + i] = at[4 * rubbed_n + i] = -200; /* no friction */
    CHECK_OK(rubbed_dynamics(&p, &s, e + 1, &work));
    for (i = 0; i < rubbed_n; i++) {
        const roln_friction o = law[i];
        const ld y = tanhl((ld)s.zd[i] / (ld)o.v), Y = tanhl((ld)s.zd[i] / (ld)o.w), dry = (ld)e[0].d[i] - (ld)e[1].d[i];
        const ld want = ((ld)o.c * (1 + (ld)o.a * y) + (ld)o.s * (1 - Y * Y) + (ld)o.l * fabsl((ld)e[0].g[i])) * y;
        CHECK(o.c == c[i] && o.v == v[i] && o.a > -1 && o.a < 1 && fabsl(want) > 1e-3L);
        BOUND("friction of its law (eps)", fabsl(dry - want) / (EPS * (fabsl(want) + fabsl((ld)e[1].d[i]))), 24);
    }
    for (i = 0; i < 6 * rubbed_n; i++) {
        const roln_real was = at[i];
        at[i] = i / rubbed_n == 5 || i % 2 ? (roln_real)NAN : 1000;
        memset(law, 7, sizeof law), memcpy(kept, law, sizeof law);
        CHECK(rubbed_friction_law(&p, law) == ROLN_E_NOT_FINITE && memcmp(law, kept, sizeof law) == 0);
        at[i] = was;
    }
    p.slope = 0;
    CHECK(rubbed_friction_law(&p, law) == ROLN_E_SHAPE && memcmp(law, kept, sizeof law) == 0);
}

void TEST_NAME(control)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_calls(k);
        test_motion(k);
        test_lift(k);
#ifdef ROLN_DOUBLE
        test_jet(k);
        test_inverse(k);
        test_power(k);
        test_inertia(k);
        test_closed_loop(k);
#endif
    }
    test_overflow();
    test_friction_of();
    test_friction_law();
    print_bounds();
}
