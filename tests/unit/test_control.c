/* Mechanics, control and guard (roln.h sections 2 and 3): units and failures of every call, jets, inverse dynamics, power,
   apparent inertia, linearisation, PD+ control, allocation to motors, and the guard under fault injection. */
#include "small.h"

void TEST_NAME(control)(void);

static roln_real th[MAXP];

/* A true autoencoder (the constraint holds) and a random network. */
static void valid(int k, uint64_t *s)
{
    static roln_real w[400];
    const roln_ae *ae = &models[k].md->ae;
    parameters(k, s, th);
    CHECK(roln_ae_init(ae, th, s, w) == ROLN_OK);
}

/* The same model, driven by tau, whatever its inputs; another integrator. */
static roln_model driven(int k, int scheme)
{
    roln_model m = *models[k].md;
    m.inputs = 0, m.scheme = scheme;
    return m;
}

#define W(k) work_of(tick_work(k))

/* ---- every call: units, work, failures ---- */

enum { ENCODE, DECODE, STEP, REDUCE, LIFT, TERMS_AT, RANGE, JET, INVERSE, INERTIA, LINEAR, CONTROL, ALLOCATE, FIT, CALLS };
enum { MOTORS = 2 };

/* Every function of prediction as one map from numbers to numbers; returns how many go in and out. */
static roln_status call(int which, int k, const roln_scale *sc, const roln_real *theta, const roln_real *in, roln_real *out, int *ni, int *no)
{
    const roln_model *m = models[k].md;
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    roln_real *w = work_of(tick_work(k)), s[32];
    roln_status st = ROLN_OK;
    roln_scale fit = {1, 1};
    switch (which) {
    case ENCODE: *ni = 2 * N, *no = 2 * n, st = roln_encode(m, sc, theta, in, in + N, NULL, out, out + n, NULL, w); break;
    case DECODE: *ni = 2 * n, *no = 2 * N, st = roln_decode(m, sc, theta, in, in + n, out, out + N, w); break;
    case STEP:
        *ni = 2 * n + nu + 1, *no = 2 * n;
        memcpy(s, in, (size_t)(2 * n) * sizeof *s);
        st = roln_step(m, sc, theta, s, s + n, in + 2 * n, in[2 * n + nu], w);
        if (st != ROLN_OK) CHECK(memcmp(s, in, (size_t)(2 * n) * sizeof *s) == 0);
        else memcpy(out, s, (size_t)(2 * n) * sizeof *s);
        break;
    case REDUCE: *ni = n + nu, *no = n, st = roln_reduce(m, sc, theta, in, in + n, out, w); break;
    case LIFT: *ni = 2 * n, *no = N, st = roln_lift(m, sc, theta, in, in + n, out, w); break;
    case TERMS_AT:
        *ni = 2 * n, *no = n * n + 3 * n + 2;
        st = roln_terms(m, sc, theta, in, in + n, out, out + n * n, out + n * n + n, out + n * n + 2 * n, out + n * n + 3 * n, out + n * n + 3 * n + 1, w);
        break;
    case RANGE: *ni = 6 * N, *no = 3 * n, st = roln_fit_range(m, sc, theta, 3, in, in + 3 * N, out, out + n, out + 2 * n, w); break;
    case JET: *ni = 3 * N, *no = 3 * n, st = roln_encode(m, sc, theta, in, in + N, in + 2 * N, out, out + n, out + 2 * n, w); break;
    case INVERSE: *ni = 4 * n, *no = n, st = roln_inverse(m, sc, theta, in, in + n, in + 2 * n, in + 3 * n, out, w); break;
    case INERTIA: *ni = n + N, *no = N, st = roln_inertia(m, sc, theta, in, in + n, out, w); break;
    case LINEAR:
        *ni = 2 * n + nu + 1, *no = 2 * n + 4 * n * n + 2 * n * nu;
        memcpy(s, in, (size_t)(2 * n) * sizeof *s);
        st = roln_linear(m, sc, theta, s, s + n, in + 2 * n, in[2 * n + nu], out + 2 * n, out + 2 * n + 4 * n * n, work_of(linear_work(k)));
        if (st != ROLN_OK) CHECK(memcmp(s, in, (size_t)(2 * n) * sizeof *s) == 0);
        else memcpy(out, s, (size_t)(2 * n) * sizeof *s);
        break;
    case CONTROL:
        *ni = 7 * n, *no = n;
        st = roln_control(m, sc, theta, in, in + n, in + 2 * n, in + 3 * n, in + 4 * n, in + 5 * n, in + 6 * n, out, w);
        break;
    case ALLOCATE:
        *ni = 2 * n + 1 + N * MOTORS, *no = MOTORS;
        st = roln_allocate(m, sc, theta, MOTORS, in, in + 2 * n + 1, in + n, in[2 * n], out, w);
        break;
    default:
        *ni = 6 * N, *no = N + 2, st = roln_fit_scale(m, 3, in, in + 3 * N, out, &fit);
        out[N] = fit.q, out[N + 1] = fit.t;
        if (st != ROLN_OK) CHECK(fit.q == 1 && fit.t == 1);
    }
    CHECK(WORK_KEPT());
    return st;
}

/* Units of the outputs of roln_linear: state, A, B */
static roln_real linear_unit(int n, int nu, int i)
{
    const roln_real q = scale.q, c = scale.t;
    if (i < 2 * n) return i < n ? 1 : 1 / c;
    i -= 2 * n;
    if (i < 4 * n * n) return (i / (2 * n) < n ? 1 : 1 / c) * (i % (2 * n) < n ? 1 : c);
    i -= 4 * n * n;
    return (i / nu < n ? 1 : 1 / c) * q * c * c;
}

static void test_calls(int k)
{
    static const roln_scale unit = {1, 1};
    static roln_real in[128], u[128], out[256], o2[256];
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    const roln_real q = scale.q, c = scale.t;
    uint64_t s = 50 + (uint64_t)k;
    int which, i, b, ni, no, rep;
    parameters(k, &s, th);
    for (which = 0; which < CALLS; which++)
        for (rep = 0; rep < 5; rep++) {
            dyadic(128, 1, &s, in);
            if (which == STEP || which == LINEAR) in[2 * n + nu] = dt / 4;
            if (which == ALLOCATE) in[2 * n] = ROLN_C(0.25);
            CHECK(call(which, k, &scale, th, in, out, &ni, &no) == ROLN_OK);
            for (i = 0; i < ni; i++) switch (which) { /* units, bit for bit */
                case ENCODE: u[i] = in[i] * (i < N ? 1 / q : c / q); break;
                case DECODE: case TERMS_AT: u[i] = in[i] * (i < n ? 1 : c); break;
                case STEP: case LINEAR: u[i] = in[i] * (i < n ? 1 : i < 2 * n ? c : i < 2 * n + nu ? q * c * c : 1 / c); break;
                case REDUCE: u[i] = in[i] * (i < n ? 1 : q); break;
                case LIFT: u[i] = in[i] * (i < n ? 1 : 1 / q); break;
                case RANGE: u[i] = in[i] * (i < 3 * N ? 1 / q : c / q); break;
                case JET: u[i] = in[i] * (i < N ? 1 / q : i < 2 * N ? c / q : c * c / q); break;
                case INVERSE: u[i] = in[i] * (i < n ? 1 : i < 3 * n ? c : c * c); break;
                case INERTIA: u[i] = in[i] * (i < n ? 1 : 1 / q); break;
                case CONTROL: u[i] = in[i] * (i / n == 0 || i / n == 2 ? 1 : i / n == 4 || i / n == 5 ? c * c : c); break;
                case ALLOCATE: u[i] = in[i] * (i < 2 * n + 1 ? 1 : q); break;
                default: u[i] = in[i];
                }
            CHECK(call(which, k, &unit, th, u, o2, &ni, &no) == ROLN_OK);
            for (b = 0, i = 0; i < no; i++) {
                const roln_real f = which == ENCODE || which == STEP ? (i < n ? 1 : 1 / c) : which == DECODE ? (i < N ? q : q / c)
                                    : which == TERMS_AT ? (i < n * n ? 1 : 1 / (c * c)) : which == RANGE ? (i < 2 * n ? 1 : 1 / c) : which == JET ? (i < n ? 1 : i < 2 * n ? 1 / c : 1 / (c * c))
                                    : which == INVERSE || which == CONTROL ? 1 / (c * c) : which == INERTIA ? 1 / q : which == LINEAR ? linear_unit(n, nu, i) : 1;
                b += out[i] != f * o2[i];
            }
            if (!CHECK(b == 0)) printf("    call %d, model %d: units\n", which, k);
            /* NaN and infinity in every input */
            for (i = 0; i < ni; i++)
                for (b = 0; b < 8; b++) { /* and the edges of the range: whatever comes out of them is finite */
                    static const roln_real edge[8] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, PICK(3.4028234e38f, 1.7976931348623157e308),
                                                      -PICK(3.4028234e38f, 1.7976931348623157e308), PICK(1e-45f, 4.9406564584124654e-324), PICK(1e19f, 1e154), PICK(-3e37f, -3e307)};
                    const roln_real x = in[i];
                    int j, kept = 0;
                    roln_status st;
                    in[i] = edge[b];
                    for (j = 0; j < 256; j++) out[j] = 7;
                    st = call(which, k, &scale, th, in, out, &ni, &no);
                    if (!CHECK(b < 3 ? st != ROLN_OK : st != ROLN_OK || roln_all_finite(no, out))) printf("    call %d, model %d, input %d, value %d\n", which, k, i, b);
                    for (j = 0; j < 256; j++) kept += out[j] == 7;
                    if (which != FIT && st != ROLN_OK && !CHECK(kept == 256)) printf("    call %d, model %d, input %d, value %d\n", which, k, i, b);
                    in[i] = x;
                }
            for (b = 0; b < 2; b++) { /* a scale that is NaN, where it is used */
                roln_scale bad = scale;
                if (b == 0) bad.q = (roln_real)NAN;
                else bad.t = (roln_real)NAN;
                if (which < FIT && (which == LINEAR || b == (which == STEP || which == TERMS_AT || which == INVERSE || which == CONTROL)))
                    CHECK(call(which, k, &bad, th, in, out, &ni, &no) != ROLN_OK);
            }
        }

    /* M zdd + c + g = tau_z, zdd from a very short step; power of the force in both worlds */
    {
        roln_real z[16], zd[16], v[16], M[64], cc[16], g[16], d[16], T, V, tau[16], tz[16], full[16], x[16], xd[16];
        ld top = 0, e, zdd[16], p = 0, r = 0, size = 0;
        const ld h = powl(2, PICK(-8, -20));
        int j;
        dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(N, 1, &s, tau);
        memcpy(v, zd, sizeof v), memcpy(x, z, sizeof x);
        CHECK(roln_terms(models[k].md, &scale, th, z, zd, M, cc, g, d, &T, &V, work_of(tick_work(k))) == ROLN_OK);
        CHECK(roln_reduce(models[k].md, &scale, th, z, tau, tz, work_of(tick_work(k))) == ROLN_OK);
        CHECK(roln_step(models[k].md, &scale, th, x, v, tau, (roln_real)h, work_of(tick_work(k))) == ROLN_OK);
        for (i = 0; i < n; i++) zdd[i] = ((ld)v[i] - (ld)zd[i]) / h, e = fabsl((ld)tz[i]) + fabsl((ld)cc[i]) + fabsl((ld)g[i]), top = e > top ? e : top;
        for (i = 0; i < n; i++) {
            for (e = 0, j = 0; j < n; j++) e += (ld)M[i * n + j] * zdd[j], p += (ld)(zd[i] * M[i * n + j] * zd[j]) / 2;
            BOUND("motion: M zdd + c + g + d = tau_z", fabsl(e + (ld)cc[i] + (ld)g[i] + (ld)d[i] - (ld)tz[i]) / top / (h + EPS / h), 30);
        }
        CHECK_NEAR((ld)T / p, 1, 20 * EPS);
        CHECK(roln_decode(models[k].md, &scale, th, z, zd, x, xd, work_of(tick_work(k))) == ROLN_OK);
        for (i = 0; i < N; i++) { /* tau, or B u */
            full[i] = models[k].md->inputs ? 0 : tau[i];
            for (j = 0; j < models[k].md->inputs; j++) full[i] += th[models[k].params - N * nu + i * nu + j] * tau[j];
        }
        for (p = 0, i = 0; i < N; i++) p += (ld)full[i] * (ld)xd[i], size += fabsl((ld)full[i] * (ld)xd[i]);
        for (i = 0; i < n; i++) r += (ld)tz[i] * (ld)zd[i];
        CHECK_NEAR(r / size, p / size, 20 * EPS);
    }
}
/* ---- mechanics ---- */

#ifdef ROLN_DOUBLE
static const double shift[4] = {1, -1, 2, -2};
#define SLOPE(v, i, h) ((8 * ((v)[0][i] - (v)[1][i]) - ((v)[2][i] - (v)[3][i])) / (12 * (h))) /* error h^4 f''''' / 30 */

/* zdd of the 3-jet: zd along the parabola q + qd t + qdd t^2 / 2. */
static void test_jet(int k)
{
    const int N = N_OF(k), n = n_OF(k);
    double q[16], qd[16], qdd[16], x[16], xd[16], z[16], zd[16], zdd[16], v[4][16], y[4][16], top = 0;
    const double h = 2e-4;
    uint64_t s = 200 + (uint64_t)k;
    int i, j;
    parameters(k, &s, th);
    dyadic(N, 1, &s, q), dyadic(N, 1, &s, qd), dyadic(N, 1, &s, qdd);
    CHECK(roln_encode(models[k].md, &scale, th, q, qd, qdd, z, zd, zdd, W(k)) == ROLN_OK);
    for (j = 0; j < 4; j++) {
        const double t = shift[j] * h;
        for (i = 0; i < N; i++) x[i] = q[i] + t * qd[i] + t * t / 2 * qdd[i], xd[i] = qd[i] + t * qdd[i];
        CHECK(roln_encode(models[k].md, &scale, th, x, xd, NULL, y[j], v[j], NULL, W(k)) == ROLN_OK);
    }
    for (i = 0; i < n; i++) top = fabs(zdd[i]) > top ? fabs(zdd[i]) : top;
    for (i = 0; i < n; i++) {
        BOUND("zd of the jet", fabs(SLOPE(y, i, h) - zd[i]) / top, 1e-9);
        BOUND("zdd of the jet", fabs(SLOPE(v, i, h) - zdd[i]) / top, 1e-9);
    }
}

/* C(z, zd) w from the Christoffel symbols, dM/dz by differences; c [n] out, and M, g, d. */
static void slow_coriolis(int k, const double *z, const double *zd, const double *w, double *M, double *c, double *g, double *d)
{
    static double v[16][4][64], D[16][64];
    const double h = 2e-3;
    const int n = n_OF(k);
    double x[16];
    int i, j, l;
    for (l = 0; l < n; l++) {
        for (j = 0; j < 4; j++) {
            memcpy(x, z, (size_t)n * sizeof *x);
            x[l] += shift[j] * h;
            CHECK(roln_terms(models[k].md, &scale, th, x, zd, v[l][j], NULL, NULL, NULL, NULL, NULL, W(k)) == ROLN_OK);
        }
        for (i = 0; i < n * n; i++) D[l][i] = SLOPE(v[l], i, h);
    }
    CHECK(roln_terms(models[k].md, &scale, th, z, zd, M, NULL, g, d, NULL, NULL, W(k)) == ROLN_OK);
    for (i = 0; i < n; i++)
        for (c[i] = 0, j = 0; j < n; j++)
            for (l = 0; l < n; l++) c[i] += (D[l][i * n + j] + D[j][i * n + l] - D[i][j * n + l]) * zd[l] * w[j] / 2;
}

/* roln_inverse and roln_control against those terms. */
static void test_inverse(int k)
{
    const int n = n_OF(k);
    double z[16], zd[16], w[16], a[16], kp[16], kd[16], M[64], c[16], g[16], d[16], out[16], top = 0, e, f, zr[16];
    uint64_t s = 210 + (uint64_t)k;
    int i, j, own;
    parameters(k, &s, th);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd), dyadic(n, 1, &s, w), dyadic(n, 1, &s, a), dyadic(n, 1, &s, kp), dyadic(n, 1, &s, kd), dyadic(n, 1, &s, zr);
    for (own = 0; own < 3; own++) { /* w, zd, control */
        slow_coriolis(k, z, zd, own == 1 ? zd : w, M, c, g, d);
        if (own < 2) CHECK(roln_inverse(models[k].md, &scale, th, z, zd, own == 1 ? NULL : w, a, out, W(k)) == ROLN_OK);
        else CHECK(roln_control(models[k].md, &scale, th, z, zd, zr, w, a, kp, kd, out, W(k)) == ROLN_OK);
        for (i = 0; i < n; i++) top = fabs(out[i]) > top ? fabs(out[i]) : top;
        for (i = 0; i < n; i++) {
            for (e = c[i] + g[i] + d[i], j = 0; j < n; j++) e += M[i * n + j] * a[j];
            f = own == 2 ? kp[i] * (z[i] - zr[i]) + kd[i] * (zd[i] - w[i]) : 0;
            BOUND("inverse dynamics, control", fabs(out[i] - e + f) / top, 1e-8); /* h^4 of the differences: 1e-10 x their size */
        }
    }
}

/* Energy gained = work of forces - dissipation; the error of the two falls with the fourth power of the step. */
static void test_power(int k)
{
    const roln_model m = driven(k, ROLN_RK4);
    const roln_model *md = models[k].md->inputs ? models[k].md : &m;
    const int n = n_OF(k), nu = roln_force_size(md);
    double z0[16], zd0[16], tau[16], z[16], zd[16], tz[16], d[16], T, V, E, e[2], moved = 0;
    uint64_t s = 220 + (uint64_t)k;
    int half, i, p;
    roln_model own = *md;
    own.scheme = ROLN_RK4;
    parameters(k, &s, th);
    dyadic(n, 1, &s, z0), dyadic(n, 1, &s, zd0), dyadic(nu, 1, &s, tau);
    for (half = 0; half < 2; half++) {
        const int steps = 40 << half;
        const double h = 0.4 / steps;
        double gained = 0, work = 0;
        memcpy(z, z0, sizeof z), memcpy(zd, zd0, sizeof zd);
        for (p = 0, moved = 0; p <= steps; p++) {
            double P = 0;
            CHECK(roln_terms(&own, &scale, th, z, zd, NULL, NULL, NULL, d, &T, &V, W(k)) == ROLN_OK);
            CHECK(roln_reduce(&own, &scale, th, z, tau, tz, W(k)) == ROLN_OK);
            for (i = 0; i < n; i++) P += zd[i] * (tz[i] - d[i]);
            E = T + V;
            gained += p == 0 ? -E : p == steps ? E : 0;
            work += h * P * (p == 0 || p == steps ? 1 : p % 2 ? 4 : 2) / 3;
            moved += h * fabs(P);
            if (p < steps) CHECK(roln_step(&own, &scale, th, z, zd, tau, h, W(k)) == ROLN_OK);
        }
        e[half] = fabs(gained - work) / moved;
    }
    BOUND("power balance", e[1], 1e-5);
    if (e[1] > 1e-11) BOUND("power balance, halved step: 16 times", fabs(log2(e[0] / e[1]) - 4), 1);
}

/* Apparent inertia: dense D^T M D, symmetric, positive semi-definite of rank n, T. */
static void test_inertia(int k)
{
    const int N = N_OF(k), n = n_OF(k);
    static double Y[16 * 16], D[16 * 16];
    double z[16], zd[16], zero[16] = {0}, q[16], qd[16], M[64], v[16], y[16], one[16], col[16], T, top = 0, e;
    uint64_t s = 230 + (uint64_t)k;
    int i, j, a, b;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, zd);
    CHECK(roln_decode(models[k].md, &scale, th, z, zd, q, qd, W(k)) == ROLN_OK);
    CHECK(roln_terms(models[k].md, &scale, th, z, zd, M, NULL, NULL, NULL, &T, NULL, W(k)) == ROLN_OK);
    for (j = 0; j < N; j++) {
        memcpy(one, zero, sizeof one), one[j] = 1;
        CHECK(roln_encode(models[k].md, &scale, th, q, one, NULL, y, col, NULL, W(k)) == ROLN_OK);
        for (a = 0; a < n; a++) D[a * N + j] = col[a];
        CHECK(roln_inertia(models[k].md, &scale, th, z, one, one, W(k)) == ROLN_OK); /* in place */
        for (i = 0; i < N; i++) Y[i * N + j] = one[i], top = fabs(one[i]) > top ? fabs(one[i]) : top;
    }
    for (i = 0; i < N; i++)
        for (j = 0; j < N; j++) {
            for (e = 0, a = 0; a < n; a++)
                for (b = 0; b < n; b++) e += D[a * N + i] * M[a * n + b] * D[b * N + j];
            BOUND("inertia - D^T M D, eps", fabs(Y[i * N + j] - e) / top / EPS, 1000);
            BOUND("inertia, asymmetry, eps", fabs(Y[i * N + j] - Y[j * N + i]) / top / EPS, 100);
        }
    CHECK(roln_inertia(models[k].md, &scale, th, z, qd, y, W(k)) == ROLN_OK);
    for (e = 0, i = 0; i < N; i++) e += qd[i] * y[i] / 2;
    BOUND("inertia, 1/2 qd^T y = T, eps", fabs(e / T - 1) / EPS, k == 3 ? 1e6 : 500);
    { /* rank: exactly n positive eigenvalues */
        static ld A[TN * TN], Q[TN * TN];
        int positive = 0;
        ld big = 0;
        widen(N * N, Y, A);
        for (i = 0; i < N; i++)
            for (j = 0; j < i; j++) A[i * N + j] = A[j * N + i];
        t_jacobi(N, A, Q);
        for (i = 0; i < N; i++) big = A[i * N + i] > big ? A[i * N + i] : big;
        for (i = 0; i < N; i++) positive += A[i * N + i] > 1e-10L * big, CHECK(A[i * N + i] > -100 * EPS * big);
        CHECK(positive == n);
    }
    dyadic(N, 1, &s, v); /* D v = 0: no inertia */
    CHECK(roln_encode(models[k].md, &scale, th, q, v, NULL, col, zd, NULL, W(k)) == ROLN_OK);
    CHECK(roln_decode(models[k].md, &scale, th, z, zd, q, qd, W(k)) == ROLN_OK);
    for (i = 0; i < N; i++) v[i] -= qd[i];
    CHECK(roln_inertia(models[k].md, &scale, th, z, v, y, W(k)) == ROLN_OK);
    for (i = 0; i < N; i++) BOUND("inertia off the manifold, eps", fabs(y[i]) / top / EPS, k == 3 ? 1e5 : 500);
}

static double inertia_form(int k, const double *z, const double *v, const double *gy)
{
    double y[16], e = 0;
    int i;
    CHECK(roln_inertia(models[k].md, &scale, th, z, v, y, W(k)) == ROLN_OK);
    for (i = 0; i < N_OF(k); i++) e += gy[i] * y[i];
    return e;
}

static void test_inertia_bwd(int k)
{
    static double g[MAXP], g1[MAXP];
    const int N = N_OF(k), n = n_OF(k), params = models[k].params;
    double z[16], v[16], gy[16], gz[16], gv[16], gz1[16], gv1[16], h = 5e-4, r[4], top[3] = {0, 0, 0};
    uint64_t s = 240 + (uint64_t)k;
    int i, j, which;
    parameters(k, &s, th);
    dyadic(n, 1, &s, z), dyadic(N, 1, &s, v), dyadic(N, 1, &s, gy);
    for (i = 0; i < params; i++) g[i] = g1[i] = 3;
    for (i = 0; i < 16; i++) gz[i] = gv[i] = gz1[i] = gv1[i] = 3;
    CHECK(roln_inertia_bwd(models[k].md, &scale, th, z, v, gy, gz, gv, g, work_of(grad_work(k, 1, 0))) == ROLN_OK && WORK_KEPT());
    for (which = 0; which < 3; which++)
        for (i = 0; i < (which == 0 ? n : which == 1 ? N : params); i++)
            top[which] = fabs((which == 0 ? gz : which == 1 ? gv : g)[i] - 3) > top[which] ? fabs((which == 0 ? gz : which == 1 ? gv : g)[i] - 3) : top[which];
    for (which = 0; which < 3; which++)
        for (i = 0; i < (which == 0 ? n : which == 1 ? N : params); i++) {
            double *x = (which == 0 ? z : which == 1 ? v : th), x0 = x[i], grad = (which == 0 ? gz : which == 1 ? gv : g)[i] - 3;
            const int mt = which == 2 ? mate(k, i) : i;
            if (mt != i) grad += g[mt] - 3;
            for (j = 0; j < 4; j++) x[i] = x[mt] = x0 + shift[j] * h, r[j] = inertia_form(k, z, v, gy);
            x[i] = x[mt] = x0;
            BOUND("inertia, backward", fabs((8 * (r[0] - r[1]) - (r[2] - r[3])) / (12 * h) - grad) / (top[which] + 1e-3), 1e-7);
        }
    for (which = 0; which < 8; which++) { /* each may be NULL, the others are the same */
        for (i = 0; i < params; i++) g1[i] = 3;
        for (i = 0; i < 16; i++) gz1[i] = gv1[i] = 3;
        CHECK(roln_inertia_bwd(models[k].md, &scale, th, z, v, gy, which & 1 ? gz1 : NULL, which & 2 ? gv1 : NULL, which & 4 ? g1 : NULL,
                               work_of(grad_work(k, 1, 0))) == ROLN_OK);
        CHECK(same(n, gz1, gz) == (which & 1) && same(N, gv1, gv) == (which & 2) / 2 && same(params, g1, g) == (which & 4) / 4);
    }
    z[0] = (double)NAN, memcpy(gz1, gz, sizeof gz);
    CHECK(roln_inertia_bwd(models[k].md, &scale, th, z, v, gy, gz1, NULL, NULL, work_of(grad_work(k, 1, 0))) == ROLN_E_NOT_FINITE && same(16, gz1, gz));
}

/* A and B against differences of roln_step, every integrator, tau and u. */
static void test_linear(int k)
{
    static double A[256], A1[256], B[512];
    const int n = n_OF(k), n2 = 2 * n;
    double x[64], y[64], z[64], r[4][64], h = 1e-3, top = 0;
    uint64_t s = 250 + (uint64_t)k;
    int scheme, i, j, p, in;
    parameters(k, &s, th);
    for (scheme = ROLN_EULER; scheme <= ROLN_MIDPOINT; scheme++)
        for (in = 0; in < 2; in++) {
            roln_model m = driven(k, scheme);
            const int nu = in ? models[k].md->inputs : m.ae.size[0];
            static roln_real work[40000];
            if (nu == 0) continue;
            if (in) m.inputs = nu;
            dyadic(n2 + nu, 1, &s, x);
            memcpy(z, x, sizeof z), memcpy(y, x, sizeof y);
            CHECK(roln_linear(&m, &scale, th, z, z + n, x + n2, dt / 8, A, B, work) == ROLN_OK);
            CHECK(roln_step(&m, &scale, th, y, y + n, x + n2, dt / 8, work) == ROLN_OK && same(n2, y, z)); /* advances like a step */
            memcpy(y, x, sizeof y);
            CHECK(roln_linear(&m, &scale, th, y, y + n, x + n2, dt / 8, A1, NULL, work) == ROLN_OK && same(n2 * n2, A, A1) && same(n2, y, z));
            for (top = 0, i = 0; i < n2 * n2; i++) top = fabs(A[i]) > top ? fabs(A[i]) : top;
            for (j = 0; j < n2 + nu; j++) {
                const double x0 = x[j];
                for (p = 0; p < 4; p++) {
                    x[j] = x0 + shift[p] * h;
                    memcpy(r[p], x, sizeof x);
                    CHECK(roln_step(&m, &scale, th, r[p], r[p] + n, x + n2, dt / 8, work) == ROLN_OK);
                }
                x[j] = x0;
                for (i = 0; i < n2; i++)
                    BOUND("linearisation", fabs(SLOPE(r, i, h) - (j < n2 ? A[i * n2 + j] : B[i * nu + j - n2])) / top, 1e-8);
            }
            for (i = 0, p = 0; i < n2 * nu; i++) p += B[i] != 0;
            CHECK(p > 0);
        }
}

/* Closed loop on the model itself: W = 1/2 ed^T M ed + 1/2 e^T Kp e falls at the rate ed^T Kd ed, and e -> 0. */
static double lyapunov(int k, const double *s, double t, const double *kp, const double *kd, double *rate, double *tau, double *sd)
{
    const int n = n_OF(k);
    double r[16], rd[16], rdd[16], M[64], c[16], g[16], d[16], e, Wt = 0, x[16];
    int i, j;
    for (i = 0; i < n; i++) r[i] = 0.3 * sin(t + i), rd[i] = 0.3 * cos(t + i), rdd[i] = -0.3 * sin(t + i);
    CHECK(roln_control(models[k].md, &scale, th, s, s + n, r, rd, rdd, kp, kd, tau, W(k)) == ROLN_OK);
    CHECK(roln_terms(models[k].md, &scale, th, s, s + n, M, c, g, d, NULL, NULL, W(k)) == ROLN_OK);
    for (*rate = 0, i = 0; i < n; i++) {
        for (e = 0, j = 0; j < n; j++) e += M[i * n + j] * (s[n + j] - rd[j]);
        Wt += (s[n + i] - rd[i]) * e / 2 + kp[i] * (s[i] - r[i]) * (s[i] - r[i]) / 2;
        *rate -= kd[i] * (s[n + i] - rd[i]) * (s[n + i] - rd[i]);
        x[i] = tau[i] - c[i] - g[i] - d[i];
    }
    CHECK(roln_chol(n, M, M) == ROLN_OK);
    roln_solve_lower(n, M, x, x), roln_solve_lower_t(n, M, x, sd + n);
    memcpy(sd, s + n, (size_t)n * sizeof *s);
    return Wt;
}

static void test_closed_loop(int k)
{
    const int n = n_OF(k);
    const double h = 0.005;
    double s[32], x[32], K[4][32], kp[16], kd[16], tau[16], rate, rates[3], Ws[3], first = 0, scrap, top = 0;
    uint64_t seed = 260 + (uint64_t)k;
    int step, i, p;
    parameters(k, &seed, th);
    dyadic(2 * n, ROLN_C(0.5), &seed, s);
    for (i = 0; i < n; i++) kp[i] = 8 + i, kd[i] = 6 + i;
    for (step = 0; step < 2000; step++) {
        const double t = step * h;
        Ws[step % 3] = lyapunov(k, s, t, kp, kd, &rate, tau, K[0]);
        rates[step % 3] = rate;
        if (step == 0) first = Ws[0];
        if (step < 600) top = fabs(rate) > top ? fabs(rate) : top;
        if (step > 0) CHECK(Ws[step % 3] <= Ws[(step + 2) % 3] + 1e-10 * first);
        if (step > 1 && step < 600) /* Simpson over two steps: h^4 */
            BOUND("dW/dt = - ed^T Kd ed", fabs((Ws[step % 3] - Ws[(step + 1) % 3]) / (2 * h) - (rates[(step + 1) % 3] + 4 * rates[(step + 2) % 3] + rates[step % 3]) / 6) / top, 1e-5);
        for (p = 1; p < 5; p++) {
            const double a = p == 3 ? h : h / 2;
            if (p == 4) break;
            for (i = 0; i < 2 * n; i++) x[i] = s[i] + a * K[p - 1][i];
            lyapunov(k, x, t + a, kp, kd, &scrap, tau, K[p]);
        }
        for (i = 0; i < 2 * n; i++) s[i] += h / 6 * (K[0][i] + 2 * K[1][i] + 2 * K[2][i] + K[3][i]);
    }
    BOUND("closed loop, W after 10 s", Ws[(step + 2) % 3] / first, 1e-4);
}
#endif

/* J^T (D^T tau_z) = tau_z where the autoencoder is true. */
static void test_lift(int k)
{
    const roln_model m = driven(k, ROLN_RK4);
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[16], tz[16], tau[16], back[16];
    uint64_t s = 270 + (uint64_t)k;
    int i;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(n, 1, &s, tz);
    (void)N;
    CHECK(roln_lift(&m, &scale, th, z, tz, tau, W(k)) == ROLN_OK && roln_reduce(&m, &scale, th, z, tau, back, W(k)) == ROLN_OK);
    for (i = 0; i < n; i++) BOUND("reduce(lift), eps", fabsl((ld)back[i] - (ld)tz[i]) / EPS, k == 3 ? 1e7L : 200); /* eight layers: D, J of size 1e3 */
}

/* Damped least squares: (G^T G + mu^2 I) u = G^T tau_z, G = J^T B by columns. */
static void test_allocate(int k)
{
    const roln_model m = driven(k, ROLN_RK4);
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[16], tz[16], B[16 * 8], col[16], Gj[16], u[8];
    uint64_t s = 280 + (uint64_t)k;
    int motors, i, j, p, r, wild = 0, missed = 0, tried = 0;
    for (motors = 1; motors <= 6; motors++)
        for (r = 0; r < 20; r++) {
            static ld G[16 * 8], A[TN * TN], rhs[TN], b[TN];
            ld top = 0, e;
            roln_real mu = 0;
            valid(k, &s);
            dyadic(n, 1, &s, z), dyadic(n, 1, &s, tz), dyadic(N * motors, 1, &s, B);
            for (j = 0; j < motors; j++) {
                for (i = 0; i < N; i++) col[i] = B[i * motors + j];
                CHECK(roln_reduce(&m, &scale, th, z, col, Gj, W(k)) == ROLN_OK);
                for (i = 0; i < n; i++) {
                    G[i * motors + j] = (ld)Gj[i];
                    mu = ROLN_ABS(Gj[i]) > mu ? ROLN_ABS(Gj[i]) : mu;
                }
            }
            mu /= 8;
            CHECK(roln_allocate(&m, &scale, th, motors, z, B, tz, mu, u, W(k)) == ROLN_OK && WORK_KEPT());
            for (j = 0; j < motors; j++) {
                for (rhs[j] = 0, i = 0; i < n; i++) rhs[j] += G[i * motors + j] * (ld)tz[i];
                for (p = 0; p < motors; p++) {
                    for (e = j == p ? (ld)mu * (ld)mu : 0, i = 0; i < n; i++) e += G[i * motors + j] * G[i * motors + p];
                    A[j * motors + p] = e;
                }
            }
            memcpy(b, rhs, sizeof b);
            t_solve(motors, 1, A, b);
            for (j = 0; j < motors; j++) top = fabsl(b[j]) > top ? fabsl(b[j]) : top;
            for (j = 0; j < motors; j++) BOUND("allocation, eps", fabsl((ld)u[j] - b[j]) / (top + 1e-3L * (ld)mu) / EPS, 5000); /* condition up to |G|^2 / mu^2 = 64 n motors */
            if (motors == n) { /* as many as z has: exact as mu -> 0 */
                const roln_real tiny = mu * PICK(1e-2f, 1e-7);
                if (roln_allocate(&m, &scale, th, motors, z, B, tz, tiny, u, W(k)) != ROLN_OK) continue;
                memcpy(A, G, (size_t)(n * n) * sizeof *A);
                for (i = 0; i < n; i++) b[i] = (ld)tz[i];
                t_solve(n, 1, A, b);
                for (top = 0, j = 0; j < n; j++) top = fabsl(b[j]) > top ? fabsl(b[j]) : top;
                if (top * (ld)mu > 0.25L) continue; /* badly placed motors: damped, or lost in rounding */
                for (j = 0; j < n; j++) CHECK_NEAR(u[j], b[j], PICK(2e-2L, 1e-9L) * top);
            }
            if (motors < n) { /* mu = 0 and too few motors: refused and u untouched, or where rounding hides it no wild torque */
                const roln_real big = 8 * mu;
                roln_status st;
                for (j = 0; j < 8; j++) u[j] = 7;
                st = roln_allocate(&m, &scale, th, motors, z, B, tz, 0, u, W(k));
                for (j = 0; j < 8; j++) wild += st == ROLN_OK && j < motors ? !(ROLN_ABS(u[j]) * big < 100) : u[j] < 7 || u[j] > 7;
                missed += st == ROLN_OK, tried++;
            }
        }
    CHECK_BELOW(wild, 0);
    CHECK_BELOW(missed, tried / 20);
}

/* ---- guard ---- */

static uint64_t noise; /* seed of the random patterns */

/* Bit patterns of every class; at >= PATTERNS - 8 they are random. Returns the number. */
enum { PATTERNS = 40 };
static roln_real pattern(int at)
{
#ifdef ROLN_DOUBLE
    static const uint64_t bits[PATTERNS - 8] = {
        0x0000000000000000u, 0x8000000000000000u, 0x0000000000000001u, 0x8000000000000001u, 0x000fffffffffffffu, 0x800fffffffffffffu, 0x0010000000000000u,
        0x8010000000000000u, 0x3ff0000000000000u, 0xbff0000000000000u, 0x7fefffffffffffffu, 0xffefffffffffffffu, 0x7ff0000000000000u, 0xfff0000000000000u,
        0x7ff8000000000000u, 0xfff8000000000000u, 0x7ff0000000000001u, 0xfff0000000000001u, 0x7ff7ffffffffffffu, 0xffffffffffffffffu, 0x7fffffffffffffffu,
        0x7ff80000deadbeefu, 0x7ff4000000000000u, 0x3cb0000000000000u, 0xbcb0000000000000u, 0x7fe0000000000000u, 0x5fe6a09e667f3bccu, 0xdfe6a09e667f3bccu,
        0x1ff0000000000000u, 0x4024000000000000u, 0xc024000000000000u, 0x40590000deadbeefu};
    uint64_t b;
#else
    static const uint32_t bits[PATTERNS - 8] = {
        0x00000000u, 0x80000000u, 0x00000001u, 0x80000001u, 0x007fffffu, 0x807fffffu, 0x00800000u, 0x80800000u, 0x3f800000u, 0xbf800000u, 0x7f7fffffu,
        0xff7fffffu, 0x7f800000u, 0xff800000u, 0x7fc00000u, 0xffc00000u, 0x7f800001u, 0xff800001u, 0x7fbfffffu, 0xffffffffu, 0x7fffffffu, 0x7fc0beefu,
        0x7fa00000u, 0x34000000u, 0xb4000000u, 0x7f000000u, 0x5f3504f3u, 0xdf3504f3u, 0x1f800000u, 0x41200000u, 0xc1200000u, 0x42c8beefu};
    uint32_t b;
#endif
    const uint64_t r = roln_rand(&noise);
    roln_real x;
    memcpy(&b, at < PATTERNS - 8 ? (const void *)(bits + at) : (const void *)&r, sizeof b);
    memcpy(&x, &b, sizeof x);
    return x;
}

/* Everything a guard reads. */
typedef struct {
    roln_real q[16], qd[16], z[16], zd[16], z_min[16], z_max[16], zd_max[16], want[16], held[16], h;
    roln_limits limits;
    roln_guard g;
    roln_status st;
} rig;

static uint32_t tick(int k, rig *x)
{
    const uint32_t before = x->g.faults;
    const uint32_t f = roln_guard_tick(models[k].md, &scale, th, x->z_min, x->z_max, x->zd_max, &x->limits, x->h, x->q, x->qd, x->z, x->zd, x->st,
                                       x->want, &x->g, x->held, W(k));
    CHECK(WORK_KEPT());
    CHECK(x->g.faults == (before | f) && f < 256); /* sticky, nothing else */
    CHECK(!(f & ROLN_FAULT_EXPIRED) || (x->held[0] <= 0 && x->held[0] >= 0));
    return f;
}

/* A state in range, at a velocity that leaves the energy residual far below the limit, and a guard two good ticks old. */
static void good(int k, rig *x)
{
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    uint64_t s = 300 + (uint64_t)k;
    int i;
    memset(x, 0, sizeof *x);
    parameters(k, &s, th);
    dyadic(N, 1, &s, x->q), dyadic(N, 1, &s, x->qd), dyadic(n, ROLN_C(0.5), &s, x->z), dyadic(n, ROLN_C(0.015625), &s, x->zd), dyadic(nu, 1, &s, x->want);
    for (i = 0; i < n; i++) x->z_min[i] = -1, x->z_max[i] = 1, x->zd_max[i] = 2;
    x->limits.margin = ROLN_C(0.25), x->limits.power = 4, x->limits.tau = ROLN_C(1.5), x->limits.hold = 3;
    x->h = ROLN_C(0.0625);
    CHECK(tick(k, x) == 0 && same(nu, x->held, x->want) && tick(k, x) == 0 && x->g.bad == 0 && x->g.known == 1 && x->g.faults == 0);
}

#define LATENT(x) (x).z_min, (x).z_max, (x).zd_max, &(x).limits, (x).h, (x).q, (x).qd
/* roln_tick is the four calls, bit for bit, with good and bad numbers, in and out of range and limits. */
static void test_tick(int k)
{
    const roln_model *md = models[k].md;
    const int N = N_OF(k), n = n_OF(k);
    roln_real ref[48], gain[32], tau_z[16];
    uint64_t s = 330 + (uint64_t)k;
    uint32_t f, seen = 0;
    int t, i, reached = 0;
    static rig a, b;
    if (md->inputs > 0) return;
    good(k, &a);
    a.limits.q_off = a.limits.qd_off = 100;
    for (i = 0; i < n; i++) a.z_min[i] = -100, a.z_max[i] = a.zd_max[i] = 100;
    for (t = 0; t < 64; t++) {
        dyadic(N, 1, &s, a.q), dyadic(N, 1, &s, a.qd), dyadic(3 * n, 1, &s, ref), dyadic(2 * n, 1, &s, gain);
        for (i = 0; i < N; i++) a.q[i] /= 16, a.qd[i] /= 64;
        if (t % 8 == 3) a.q[t % N] = (roln_real)NAN;
        if (t % 8 == 4) ref[t % (3 * n)] = (roln_real)INFINITY;
        if (t % 8 == 5) a.zd_max[t % n] = t % 16 == 5 ? 0 : 100;
        if (t % 16 == 1) a.g.bad = 0, a.g.faults = 0;
        if (t == 40) memset(&a.limits.q_off, 0, 2 * sizeof a.limits.q_off);
        a.limits.tau = t % 8 == 6 ? ROLN_C(0.0009765625) : 1000;
        a.limits.power = t % 8 == 7 ? ROLN_C(0.0009765625) : t == 48 ? 0 : 1000;
        b = a;
        memset(a.want, 0, sizeof a.want);
        a.st = roln_encode(md, &scale, th, a.q, a.qd, NULL, a.z, a.zd, NULL, W(k));
        if (a.st == ROLN_OK) a.st = roln_control(md, &scale, th, a.z, a.zd, ref, ref + n, ref + 2 * n, gain, gain + n, tau_z, W(k));
        if (a.st == ROLN_OK) a.st = roln_lift(md, &scale, th, a.z, tau_z, a.want, W(k));
        f = roln_guard_tick(md, &scale, th, LATENT(a), a.z, a.zd, a.st, a.want, &a.g, a.held, W(k));
        CHECK(roln_tick(md, &scale, th, LATENT(b), ref, ref + n, ref + 2 * n, gain, gain + n, b.z, b.zd, &b.g, b.held, W(k)) == f);
        CHECK(WORK_KEPT());
        CHECK(memcmp(&a.g, &b.g, sizeof a.g) == 0 && same(N, a.held, b.held) && same(n, a.z, b.z) && same(n, a.zd, b.zd));
        seen |= f, reached += f == 0 && a.g.known;
    }
    CHECK(reached > 2); /* all well, the balance known */
    CHECK((seen & 27) == (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | ROLN_FAULT_LIMIT | ROLN_FAULT_RANGE));
    CHECK(k == 1 || k == 2 || (seen & ROLN_FAULT_ENERGY)); /* in these two few states have any balance */
}

static int finite_in(int n, const roln_real *x, roln_real top)
{
    int i, ok = 1;
    for (i = 0; i < n; i++) ok &= roln_finite(x[i]) && ROLN_ABS(x[i]) <= top;
    return ok;
}

/* Every pattern in every number, alone and together with another fault (so that the old torque would be held). */
static void test_guard_patterns(int k)
{
    static const char *const names[] = {"q", "qd", "z", "zd", "want", "held", "margin", "power", "tau", "dt", "energy", "last power", "z_min", "z_max", "zd_max"};
    const int N = N_OF(k), n = n_OF(k), nu = F_OF(k);
    static rig start, x;
    int field, i, p, with, after;
    good(k, &start);
    for (field = 0; field < 15; field++)
        for (i = 0; i < (field < 2 ? N : field < 4 || field > 11 ? n : field < 6 ? nu : 1); i++)
            for (p = 0; p < PATTERNS; p++)
                for (with = 0; with < 2; with++) {
                    roln_real *const at[15] = {x.q + i, x.qd + i, x.z + i, x.zd + i, x.want + i, x.held + i, &x.limits.margin, &x.limits.power, &x.limits.tau, &x.h,
                                               &x.g.energy, &x.g.power, x.z_min + i, x.z_max + i, x.zd_max + i};
                    const roln_real v = pattern(p);
                    const int fin = roln_finite(v);
                    uint32_t f, must = 0;
                    roln_real top;
                    int ok;
                    x = start;
                    x.st = with ? ROLN_E_NOT_SPD : ROLN_OK;
                    *at[field] = v;
                    top = field == 8 ? (v >= 0 ? v : 0) : x.limits.tau; /* no torque at all under a limit that is none */
                    f = tick(k, &x);
                    ok = finite_in(nu, x.held, top);
                    if (field < 2 && !fin) must = ROLN_FAULT_INPUT;
                    if ((field == 2 && !(ROLN_ABS(v) <= ROLN_C(1.5))) || (field == 3 && !(ROLN_ABS(v) <= ROLN_C(2.5)))) must = ROLN_FAULT_RANGE;
                    if (field == 4) must = !fin ? ROLN_FAULT_OUTPUT : !(ROLN_ABS(v) <= ROLN_C(1.5)) ? ROLN_FAULT_LIMIT : 0;
                    if (field == 9 && (!fin || !(v > 0))) ok &= f != 0;               /* no time passed, or it ran backwards */
                    if (field >= 6 && field <= 8 && !fin) ok &= f != 0;                /* a limit that is none limits nothing */
                    if (field >= 6 && field <= 8 && v != v) ok &= f != 0;
                    if ((field == 10 || field == 11) && !fin) must = with ? 0 : ROLN_FAULT_ENERGY;
                    if (field > 11 && v != v) must = ROLN_FAULT_RANGE;
                    ok &= (f & must) == must && (!with || (f & ROLN_FAULT_STATUS));
                    if (f == 0) ok &= same(nu, x.held, x.want); /* no fault: what was wanted */
                    if (field < 2 && fin && !with) ok &= f == 0; /* any finite measurement is one */
                    if (!CHECK(ok)) printf("    model %d, %s[%d] = %g (pattern %d), status %d: faults %u, torque %g, limit %g\n", k, names[field], i, (double)v, p, with,
                                           (unsigned)f, (double)x.held[field == 5 ? i : 0], (double)x.limits.tau);
                    /* mended: good again at the second good tick at the latest (the first may still see the jump in energy), its faults remembered */
                    if (field >= 6 && field < 12) x.limits = start.limits, x.h = start.h;
                    memcpy(x.q, start.q, sizeof x.q), memcpy(x.qd, start.qd, sizeof x.qd), memcpy(x.z, start.z, sizeof x.z), memcpy(x.zd, start.zd, sizeof x.zd);
                    memcpy(x.z_min, start.z_min, sizeof x.z_min), memcpy(x.z_max, start.z_max, sizeof x.z_max), memcpy(x.zd_max, start.zd_max, sizeof x.zd_max);
                    memcpy(x.want, start.want, sizeof x.want);
                    x.st = ROLN_OK;
                    for (after = 0; after < 2; after++) {
                        f = tick(k, &x);
                        CHECK(finite_in(nu, x.held, x.limits.tau) && (x.g.faults & must) == must);
                        if (after == 0 && f) CHECK(f == ROLN_FAULT_ENERGY);
                    }
                    if (!CHECK(f == 0 && same(nu, x.held, x.want))) printf("    model %d, %s[%d] = %g does not recover: %u\n", k, names[field], i, (double)v, (unsigned)f);
                }
    for (p = -3; p < 40; p++) { /* every status, and numbers that are none */
        x = start, x.st = (roln_status)p;
        CHECK(tick(k, &x) == (p == 0 ? 0 : (uint32_t)ROLN_FAULT_STATUS) && finite_in(nu, x.held, ROLN_C(1.5)));
    }
}

/* What z does not see: q, qd off the manifold, in any joint; limits of 0 do not look, limits that are none are a fault. */
static void test_guard_manifold(int k)
{
    static rig start, x;
    const int N = N_OF(k), n = n_OF(k);
    const roln_real off = ROLN_C(0.015625), bad[3] = {-1, (roln_real)NAN, (roln_real)INFINITY};
    int i, side;
    good(k, &start);
    CHECK(roln_decode(models[k].md, &scale, th, start.z, start.zd, start.q, start.qd, W(k)) == ROLN_OK);
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
        }
    for (i = 0; i < 3; i++) {
        x = start, x.limits.q_off = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
        x = start, x.limits.qd_off = bad[i];
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = 0; i < 3; i++) { /* a negative limit is none */
        x = start;
        *(i == 0 ? &x.limits.margin : i == 1 ? &x.limits.power : &x.limits.tau) = -1;
        CHECK(tick(k, &x) & ROLN_FAULT_INPUT);
    }
    for (i = 0; i < 3; i++) { /* an old torque that is none, under a limit that is none */
        x = start, x.limits.tau = (roln_real)INFINITY;
        x.held[F_OF(k) - 1] = i == 0 ? (roln_real)INFINITY : i == 1 ? -(roln_real)INFINITY : (roln_real)NAN;
        CHECK((tick(k, &x) & ROLN_FAULT_INPUT) && finite_in(F_OF(k), x.held, x.limits.power));
    }
    x = start, x.z[n - 1] = (roln_real)NAN;
    CHECK((tick(k, &x) & (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE)) == (ROLN_FAULT_STATUS | ROLN_FAULT_RANGE));
}

/* Counters out of order: whatever bad, known, faults and hold are, the torque is safe and a corrupted count does not hold for ever. */
static void test_guard_counters(int k)
{
    static const int counts[9] = {-2147483647 - 1, -2147483647, -1, 0, 1, 4, 1000, 2147483646, 2147483647};
    const int nu = F_OF(k);
    static rig start, x;
    int b, h, t;
    good(k, &start);
    for (b = 0; b < 9; b++)
        for (h = 0; h < 9; h++) {
            x = start, x.g.bad = counts[b], x.limits.hold = counts[h], x.g.known = counts[(b + h) % 9];
            x.st = ROLN_E_NOT_SPD;
            for (t = 0; t < 4; t++) {
                const uint32_t f = tick(k, &x);
                CHECK((f & ROLN_FAULT_STATUS) && finite_in(nu, x.held, x.limits.tau));
                if (counts[h] <= 0 || counts[b] < 0) CHECK(f & ROLN_FAULT_EXPIRED); /* no holding; a count below zero is none */
            }
        }
    for (b = 0; b < 128; b++) { /* any fault word: EXPIRED stays, the others do not matter */
        x = start, x.g.faults = (uint32_t)b;
        CHECK(tick(k, &x) == (uint32_t)(b & ROLN_FAULT_EXPIRED) && x.g.faults == (uint32_t)b);
    }
}

/* Random good and bad ticks against a counter. */
static void test_guard_hold(int k)
{
    const int nu = F_OF(k);
    static rig start, x;
    roln_real last[16];
    uint64_t s = 310 + (uint64_t)k;
    int hold, t, i, run, bad, over;
    good(k, &start);
    for (hold = 0; hold <= 5; hold++) { /* exactly hold ticks */
        x = start, x.limits.hold = hold;
        memcpy(last, x.held, sizeof last);
        for (t = 1; t <= hold + 3; t++) {
            x.want[0] = (roln_real)NAN;
            CHECK(tick(k, &x) == (uint32_t)(ROLN_FAULT_OUTPUT | (t > hold ? ROLN_FAULT_EXPIRED : 0)));
            for (i = 0; i < nu; i++) CHECK(!(x.held[i] < (t > hold ? 0 : last[i]) || x.held[i] > (t > hold ? 0 : last[i])));
        }
        x.want[0] = last[0];
        for (t = 0; t < 5; t++) { /* good again: too late */
            const uint32_t f = tick(k, &x);
            CHECK((f & ROLN_FAULT_EXPIRED) && (f & ~(uint32_t)ROLN_FAULT_ENERGY) == ROLN_FAULT_EXPIRED && finite_in(nu, x.held, 0));
        }
        CHECK((x.g.faults & ~(uint32_t)ROLN_FAULT_ENERGY) == (ROLN_FAULT_OUTPUT | ROLN_FAULT_EXPIRED));
        memset(&x.g, 0, sizeof x.g); /* zeroed */
        CHECK(tick(k, &x) == 0 && same(nu, x.held, x.want) && x.g.faults == 0);
    }
    for (run = 0; run < 200; run++) {
        x = start, x.limits.power = run % 2 ? 0 : start.limits.power, x.limits.hold = roln_randint(4, &s);
        memcpy(last, x.held, sizeof last);
        for (bad = over = 0, t = 0; t < 40; t++) {
            const int what = roln_randint(12, &s);
            uint32_t f, want = 0;
            memcpy(x.z, start.z, sizeof x.z), memcpy(x.qd, start.qd, sizeof x.qd), x.st = ROLN_OK;
            for (i = 0; i < nu; i++) x.want[i] = start.held[i] * (1 + (roln_real)(t % 3) / 64);
            if (what == 0) want = ROLN_FAULT_INPUT, x.qd[0] = (roln_real)INFINITY;
            if (what == 1) want = ROLN_FAULT_STATUS, x.st = ROLN_E_RANGE;
            if (what == 2) want = ROLN_FAULT_OUTPUT, x.want[nu - 1] = (roln_real)NAN;
            if (what == 3) want = ROLN_FAULT_LIMIT, x.want[0] = ROLN_C(-1.5) * (1 + 2 * ROLN_EPS);
            if (what == 4) want = ROLN_FAULT_RANGE, x.z[0] = 3;
            f = tick(k, &x);
            bad = want ? bad + 1 : over ? bad + 1 : 0;
            over |= bad > x.limits.hold;
            if (over) want |= ROLN_FAULT_EXPIRED;
            CHECK(f == want);
            for (i = 0; i < nu; i++) last[i] = over ? 0 : want ? last[i] : x.want[i];
            CHECK(same(nu, last, x.held) || over);
            CHECK(finite_in(nu, x.held, over ? 0 : x.limits.tau));
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
            const roln_real sign = side % 2 ? 1 : -1, edge = side < 2 ? ROLN_C(1.5) : ROLN_C(2.5);
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

#ifdef ROLN_DOUBLE
/* The energy check along a motion of the model, `ticks` ticks of h: smallest limit that passes, by bisection. push: a force on
   the joints that the guard does not know; heavy: the guard's model has M e^heavy. */
static double residual(int k, double h, double push, double heavy, double *power)
{
    const int n = n_OF(k), nu = F_OF(k), N = N_OF(k);
    static double z[300][16], zd[300][16], want[300][16], own[MAXP];
    const roln_model m = driven(k, ROLN_RK4);
    roln_model ours = *models[k].md;
    const int ticks = (int)(0.5 / h), inside = 20;
    double s0[32], tau[16], tz[16], lo = 0, hi = 0, none[16] = {0}, ext[16];
    uint64_t s = 320 + (uint64_t)k;
    int t, i, j, p, it;
    static rig x;
    ours.scheme = ROLN_RK4;
    parameters(k, &s, th);
    memcpy(own, th, sizeof own);
    dyadic(2 * n, ROLN_C(0.5), &s, s0);
    dyadic(N, 1, &s, ext);
    *power = 0;
    for (t = 0; t < ticks; t++) {
        double P = 0;
        for (i = 0; i < nu; i++) want[t][i] = 0.5 * sin(3 * t * h + i);
        memcpy(z[t], s0, sizeof *z), memcpy(zd[t], s0 + n, sizeof *zd);
        for (i = 0; i < N; i++) {
            tau[i] = push * ext[i] + (ours.inputs ? 0 : want[t][i]);
            for (j = 0; j < ours.inputs; j++) tau[i] += th[models[k].params - N * nu + i * nu + j] * want[t][j];
        }
        for (i = 0; i < N; i++) none[i] = push * ext[i];
        CHECK(roln_reduce(&m, &scale, th, z[t], none, tz, W(k)) == ROLN_OK);
        for (i = 0; i < n; i++) P += tz[i] * zd[t][i];
        *power = fabs(P) > *power ? fabs(P) : *power;
        for (p = 0; p < inside; p++) CHECK(roln_step(&m, &scale, th, s0, s0 + n, tau, h / inside, W(k)) == ROLN_OK);
    }
    if (heavy > 0 || heavy < 0) {
        const roln_lnn *f = &models[k].md->lnn;
        for (i = 0; i < n; i++) th[roln_ae_params(&models[k].md->ae) + roln_mlp_params(&f->mass) - ROLN_TRI(f->width[0]) + i] += heavy; /* U + heavy I */
    }
    for (hi = 1e4, it = 0; it < 45; it++) {
        const double mid = it == 0 ? hi : sqrt((lo + 1e-14) * hi);
        int caught = 0;
        memset(&x, 0, sizeof x);
        for (i = 0; i < n; i++) x.z_min[i] = -9, x.z_max[i] = 9, x.zd_max[i] = 99;
        x.limits.tau = 9, x.limits.power = mid, x.limits.hold = 1000, x.h = h;
        for (t = 0; t < ticks; t++) {
            uint32_t f;
            memcpy(x.z, z[t], sizeof *z), memcpy(x.zd, zd[t], sizeof *zd), memcpy(x.want, want[t], sizeof *want);
            f = tick(k, &x);
            CHECK((f & ~(uint32_t)ROLN_FAULT_ENERGY) == 0);
            memcpy(x.held, want[t], sizeof *want); /* what the motors did: the model's own motion goes on */
            if (f) { caught = 1; break; }
        }
        if (it == 0) CHECK(!caught);
        else if (caught) lo = mid;
        else hi = mid;
    }
    memcpy(th, own, sizeof own);
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
    if (!rolni_formed(&models[k].md->lnn) && !models[k].md->lnn.base) {
        wrong = residual(k, 1 / 256., 0, 0.4, &P);
        CHECK(wrong > 20 * r[2]);
#ifdef ROLN_TEST_VERBOSE
        printf("guard, model %d: residual %.2e %.2e %.2e W; pushed %.3f W; M off by half: %.3f W\n", k, r[0], r[1], r[2], pushed, wrong);
#endif
    }
}
#endif

/* The shell is the generic functions with the model filled in. */
static void test_shell(void)
{
    static mf_params p;
    static mf_work work;
    static mf_linwork lin;
    static mf_guard g, g1;
    static rig x;
    mf_state full;
    mf_latent s, s1;
    mf_target r, r1;
    roln_real v[2][6], A[2][36], B[2][12], a[2][6], zd2[3], kp[3], kd[3], motors[6 * 4];
    uint64_t seed = 330;
    good(5, &x);
    p.scale = scale;
    memcpy(p.theta, th, sizeof p.theta);
    memcpy(p.z_min, x.z_min, sizeof p.z_min), memcpy(p.z_max, x.z_max, sizeof p.z_max), memcpy(p.zd_max, x.zd_max, sizeof p.zd_max);
    memcpy(full.q, x.q, sizeof full.q), memcpy(full.qd, x.qd, sizeof full.qd), memcpy(s.z, x.z, sizeof s.z), memcpy(s.zd, x.zd, sizeof s.zd);
    dyadic(6, 1, &seed, v[0]), dyadic(3, 1, &seed, zd2), dyadic(3, 1, &seed, kp), dyadic(3, 1, &seed, kd), dyadic(24, 1, &seed, motors);
#define GENERIC &mf_model, &p.scale, p.theta
    CHECK(mf_aim(&p, full.q, full.qd, v[0], &r, &work) == ROLN_OK);
    CHECK(roln_encode(GENERIC, full.q, full.qd, v[0], r1.z, r1.zd, r1.zdd, work.w) == ROLN_OK && memcmp(&r, &r1, sizeof r) == 0);
    CHECK(mf_inverse(&p, &s, zd2, kp, a[0], &work) == ROLN_OK && roln_inverse(GENERIC, s.z, s.zd, zd2, kp, a[1], work.w) == ROLN_OK && same(3, a[0], a[1]));
    CHECK(mf_control(&p, &s, &r, kp, kd, a[0], &work) == ROLN_OK);
    CHECK(roln_control(GENERIC, s.z, s.zd, r.z, r.zd, r.zdd, kp, kd, a[1], work.w) == ROLN_OK && same(3, a[0], a[1]));
    CHECK(mf_inertia(&p, &s, v[0], v[1], &work) == ROLN_OK && roln_inertia(GENERIC, s.z, v[0], a[1], work.w) == ROLN_OK && same(6, v[1], a[1]));
    CHECK(mf_allocate(&p, &s, 4, motors, zd2, ROLN_C(0.5), a[0], &work) == ROLN_OK);
    CHECK(roln_allocate(GENERIC, 4, s.z, motors, zd2, ROLN_C(0.5), a[1], work.w) == ROLN_OK && same(4, a[0], a[1]));
    s1 = s;
    CHECK(mf_linear(&p, &s1, v[0], dt, A[0], B[0], &lin) == ROLN_OK);
    s1 = s;
    CHECK(roln_linear(GENERIC, s1.z, s1.zd, v[0], dt, A[1], B[1], lin.w) == ROLN_OK && same(36, A[0], A[1]) && same(12, B[0], B[1]));
    memset(&g, 0, sizeof g), memset(&g1, 0, sizeof g1);
    CHECK(mf_guard_tick(&p, &x.limits, x.h, &full, &s, ROLN_OK, x.want, &g, &work) == 0 && same(2, g.tau, x.want));
    full.qd[5] = (roln_real)NAN; /* the last number counts */
    CHECK(mf_guard_tick(&p, &x.limits, x.h, &full, &s, ROLN_OK, x.want, &g, &work) == ROLN_FAULT_INPUT && same(2, g.tau, x.want) && g.g.bad == 1);
    full.qd[5] = 0, p.zd_max[2] = -1;
    CHECK(mf_guard_tick(&p, &x.limits, x.h, &full, &s, ROLN_OK, x.want, &g, &work) == ROLN_FAULT_RANGE && g.g.faults == (ROLN_FAULT_INPUT | ROLN_FAULT_RANGE));
}

/* Units can overflow where the network's own numbers do not: never infinity with ROLN_OK. */
static void test_overflow(void)
{
    const roln_scale tiny = {1, PICK(ROLN_C(0.0009765625), 9.5367431640625e-7)};
    roln_real z[2] = {0, 0}, zd[2] = {0, 0}, tau[4], A[16], B[16];
    uint64_t s = 340;
    roln_model m = driven(6, ROLN_EULER);
    int i, e;
    parameters(6, &s, th);
    for (e = 0; e < (int)(8 * sizeof(roln_real)); e++) {
        for (i = 0; i < 4; i++) tau[i] = PICK(1e30f, 1e290) * (roln_real)(1 << (e % 30)) * (e >= 30 ? ROLN_C(1e9) : 1);
        memset(z, 0, sizeof z), memset(zd, 0, sizeof zd);
        if (roln_step(&m, &tiny, th, z, zd, tau, 8, W(6)) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
        memset(z, 0, sizeof z), memset(zd, 0, sizeof zd);
        if (roln_linear(&m, &tiny, th, z, zd, tau, 8, A, B, work_of(linear_work(6))) == ROLN_OK) CHECK(roln_all_finite(2, z) && roln_all_finite(2, zd));
    }
}

void TEST_NAME(control)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_calls(k);
        test_lift(k);
        test_allocate(k);
#ifdef ROLN_DOUBLE
        test_jet(k);
        test_inverse(k);
        test_power(k);
        test_inertia(k);
        test_inertia_bwd(k);
        test_linear(k);
        test_closed_loop(k);
        test_guard_energy(k);
#endif
        test_guard_patterns(k), test_guard_manifold(k);
        test_guard_counters(k);
        test_guard_hold(k);
        test_guard_range(k);
        test_tick(k);
    }
    test_shell();
    test_overflow();
    print_bounds();
}
