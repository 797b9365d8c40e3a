/* SPDX-License-Identifier: MIT */
/* floats.c - the worst error of every function of one float in the headers, over all 2^32 of them, against double.

       floats [EVERY]     of each 1024 floats that follow each other every EVERY-th; 1, all, if left out: a quarter of an hour

   A row: function, unit, worst error, where, bound. ulp: of the result, denormal or not; eps: 2^-23, of sine, cosine, angle for
   |x| <= 3000, and beyond, up to 2^20, half an ulp of x; of the activation of the encoder and its slope eps k1/k, relative; that of
   the decoder must be its mirror, bit for bit. NaN and infinities must be met exactly, and what is no input of a function must give
   NaN. Last line: N passed, N failed. */
#include "roln_ae.h"
#include "floats.h"

#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { COUNT = 1024 }; /* floats of a block, which share sign and exponent */

static const struct {
    const char *name, *unit;
    double bound;
} rows[FUNCTIONS + 3] = {
    {"roln_exp", "ulp", 1}, {"roln_expm1", "ulp", 1.4}, {"roln_log", "ulp", 1}, {"roln_log1p", "ulp", 1.4},
    {"roln_sinhc", "ulp", 2.5}, {"roln_softplus", "ulp", 2.1}, {"roln_sigmoid", "ulp", 2.5}, {"roln_tanh", "ulp", 3.6},
    {"ROLN_SQRT", "ulp", 0.5}, {"roln_sincos, sine", "eps", 0.7}, {"roln_sincos, cosine", "eps", 0.7}, {"roln_wrap", "eps", 1.3},
    {"activation", "eps k1/k", 3}, {"its slope", "eps k1/k", 3}, {"its curvature", "eps k2", 9},
    {"roln_sincos, sine, beyond 3000", "half an ulp of x", 1.1}, {"roln_sincos, cosine, beyond 3000", "half an ulp of x", 1.1},
    {"roln_wrap, beyond 3000", "half an ulp of x", 1.1}};

static struct {
    double error;
    float at;
    long wrong; /* NaN, infinities */
} worst[FUNCTIONS + 3];

static rolni_knee knee;

/* The activation of the encoder; that of the decoder is its mirror. */
static void activate(int f, int n, const float *x, float *y)
{
    static float a[3 * COUNT], s[3 * COUNT], t[3 * COUNT];
    const int plane = f - VALUE;
    int i;
    for (i = 0; i < n; i++)
        a[i] = x[i], a[n + i] = 1, a[2 * n + i] = 0;
    rolni_act(&knee, 1, plane + 1, n, a, s);
    for (i = 0; i < n; i++)
        a[i] = -x[i];
    rolni_act(&knee, -1, plane + 1, n, a, t);
    for (i = 0; i < n; i++) {
        const float mirror = plane == 1 ? t[plane * n + i] : -t[plane * n + i];
        y[i] = s[plane * n + i];
        worst[f].wrong += rolni_bits(y[i]) != rolni_bits(mirror) && y[i] == y[i];
    }
}

static void apply(int f, int n, const float *x, float *y)
{
    static float s[COUNT], c[COUNT]; /* of the function before, on the same x */
    int i;
    switch (f) {
    case EXP: for (i = 0; i < n; i++) y[i] = rolni_exp(x[i]); break; /* roln_exp, as vector code */
    case EXPM1: for (i = 0; i < n; i++) y[i] = roln_expm1(x[i]); break;
    case LOG: for (i = 0; i < n; i++) y[i] = roln_log(x[i]); break;
    case LOG1P: for (i = 0; i < n; i++) y[i] = roln_log1p(x[i]); break;
    case SINHC: for (i = 0; i < n; i++) y[i] = roln_sinhc(x[i]); break;
    case SOFTPLUS: roln_softplus_n(n, x, y, s); break;
    case SIGMOID: memcpy(y, s, sizeof s); break;
    case TANH: for (i = 0; i < n; i++) y[i] = roln_tanh(x[i]); break;
    case SQRT: for (i = 0; i < n; i++) y[i] = ROLN_SQRT(x[i]); break;
    case SIN: for (i = 0; i < n; i++) roln_sincos(x[i], &y[i], &c[i]); break;
    case COS: memcpy(y, c, sizeof c); break;
    case WRAP: for (i = 0; i < n; i++) y[i] = roln_wrap(x[i]); break;
    default: activate(f, n, x, y);
    }
}

/* 2^-e of numbers whose unit in the last place is 2^e, for what lies in a float; beside the largest float its unit. */
static double places(double r)
{
    int64_t b;
    double unit;
    memcpy(&b, &r, sizeof b);
    b = (int64_t)((uint64_t)b >> 52 & 0x7ff) - 1023;
    b = b < -126 ? -126 : b > 127 ? 127 : b;
    b = (int64_t)((uint64_t)(1023 + 23 - b) << 52);
    memcpy(&unit, &b, sizeof unit);
    return unit;
}

/* y and the reference r, both within +-end, in units of row f. */
static double off(int f, float x, float y, double r)
{
    const double end = 340282366920938463463374607431768211456.0, turn = 6.283185307179586477; /* 2^128 */
    double v = (double)y, d;
    v = v > end ? end : v < -end ? -end : v; /* NaN stays */
    r = r > end ? end : r < -end ? -end : r;
    d = v - r;
    if (f == WRAP) d -= turn * __builtin_rint(d / turn);
    d = d < 0 ? -d : d;
    if (f < SIN) return d * places(r);
    if (f < VALUE) return x > 3000 || x < -3000 ? 2 * d * places((double)x) : d / (double)ROLN_EPS;
    if (f == CURVE) return d / ((double)ROLN_EPS * (double)knee.k2);
    return d / (r < 0 ? -r : r) / ((double)ROLN_EPS * (double)(knee.k1 / SLOPE));
}

/* What is asked where there is no number: NaN, or an infinity. */
static float special(int f, float x)
{
    const float inf = rolni_real(ROLNI_INF), nan = rolni_real(ROLNI_INF | (ROLNI_INF >> 1));
    const int low = (int)(rolni_bits(x) >> 31);
    if (x != x) return nan;
    switch (f) {
    case EXP: case SOFTPLUS: return low ? 0 : inf;
    case EXPM1: return low ? -1 : inf;
    case LOG: case LOG1P: case SQRT: return low ? nan : inf;
    case SINHC: return inf;
    case SIGMOID: return low ? 0.0f : 1.0f;
    case TANH: return low ? -1.0f : 1.0f;
    case SIN: case COS: case WRAP: return nan;
    case RISE: return low ? knee.k1 + knee.k2 : knee.k1 - knee.k2;
    case CURVE: return 0;
    default: return x;
    }
}

/* Nonzero if x is none of the function's. */
static int outside(int f, float x)
{
    return (f == LOG || f == SQRT) ? x < 0 : f == LOG1P ? x < -1 : f >= SIN && f <= WRAP && (x > 1048576 || x < -1048576);
}

/* Nonzero if x is 0, a pole or none of the function's. */
static int edge(int f, float x)
{
    return outside(f, x) || (x >= 0 && x <= 0) || (f == LOG1P && x <= -1);
}

static void block(int f, uint32_t first)
{
    static float x[COUNT], y[COUNT];
    static double r[COUNT];
    const int far = f >= SIN && f <= WRAP && ROLN_ABS(rolni_real(first)) >= 3000; /* 3000 begins a block */
    const int row = far ? FUNCTIONS + f - SIN : f;
    double u[COUNT];
    int64_t least;
    int i;
    for (i = 0; i < COUNT; i++)
        x[i] = rolni_real(first + (uint32_t)i);
    apply(f, COUNT, x, y);
    if ((first & 0x7f800000) == 0x7f800000) {
        for (i = 0; i < COUNT; i++) {
            const float want = special(f, x[i]);
            const int near = rolni_bits(y[i]) == rolni_bits(want) || ROLN_ABS(y[i] - want) < 1e-6f;
            worst[row].wrong += !(want != want ? y[i] != y[i] : near);
        }
        return;
    }
    if (outside(f, x[0]) && outside(f, x[COUNT - 1])) {
        for (i = 0; i < COUNT; i++)
            worst[row].wrong += y[i] == y[i];
        return;
    }
    reference(f, COUNT, x, r);
    for (i = 0; i < COUNT; i++)
        u[i] = off(f, x[i], y[i], r[i]);
    if (!edge(f, x[0]) && !edge(f, x[COUNT - 1])) { /* as integers they have the same order, and NaN is above all numbers */
        int64_t most = 0, b;
        memcpy(&least, &worst[row].error, sizeof least);
        for (i = 0; i < COUNT; i++)
            memcpy(&b, &u[i], sizeof b), most = b > most ? b : most;
        if (most <= least) return;
    }
    for (i = 0; i < COUNT; i++) {
        const int zero = x[i] >= 0 && x[i] <= 0, pole = (f == LOG && zero) || (f == LOG1P && x[i] >= -1 && x[i] <= -1);
        if (outside(f, x[i])) worst[row].wrong += y[i] == y[i];
        else if (pole) worst[row].wrong += rolni_bits(y[i]) != (ROLNI_SIGN | ROLNI_INF);
        else if (zero && (f == SINHC || f == VALUE))
            worst[row].wrong += rolni_bits(y[i]) != (f == SINHC ? rolni_bits(1) : rolni_bits(x[i]));
        else if (!(u[i] <= worst[row].error)) worst[row].error = u[i] == u[i] ? u[i] : 1e30, worst[row].at = x[i];
    }
}

int main(int argc, char **argv)
{
    const int every = argc > 1 ? atoi(argv[1]) : 1;
    const long blocks = 0x100000000 / COUNT;
    int f, failed = 0;
    long k;
    knee = rolni_knee_of(SLOPE);
    for (k = 0; k < blocks; k++) {
        if (k % every != 0 && k % 8192 != 0 && k % 8192 != 8191) continue; /* of a sample the ends of every exponent, too */
        for (f = 0; f < FUNCTIONS; f++)
            block(f, (uint32_t)(k * COUNT));
        if (k % 32768 == 0) fprintf(stderr, "\r%ld %%, %ld s", 100 * k / blocks, (long)(clock() / CLOCKS_PER_SEC));
    }
    fprintf(stderr, "\r");
    for (f = 0; f < FUNCTIONS + 3; f++) {
        const int bad = !(worst[f].error <= rows[f].bound) || worst[f].wrong != 0;
        printf("| %-34s | %-16s | %.3f | %.9g | %g |%s\n", rows[f].name, rows[f].unit, worst[f].error, (double)worst[f].at,
               rows[f].bound, bad ? " failed" : "");
        if (worst[f].wrong) printf("%ld NaN or infinities\n", worst[f].wrong);
        failed += bad;
    }
    printf("%d passed, %d failed\n", FUNCTIONS + 3 - failed, failed);
    return failed != 0;
}
