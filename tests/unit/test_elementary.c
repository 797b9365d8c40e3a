/* SPDX-License-Identifier: MIT */
/* Elementary functions against libm. Float: every bit pattern that makes a difference, against double libm.
   Double: random and structured points against long double libm. The bounds are the worst
   errors stated in roln_spd.h, rounded up. */
#include "roln_spd.h"
#include "check.h"

#include <float.h>

#ifdef ROLN_DOUBLE
typedef long double wide;
#define MIN_EXP DBL_MIN_EXP
#define MANT_DIG DBL_MANT_DIG
#define REF(f) f##l
#define BOUND(f, d) (d)
#else
typedef double wide;
#define MIN_EXP FLT_MIN_EXP
#define MANT_DIG FLT_MANT_DIG
#define REF(f) f
#define BOUND(f, d) (f)
#endif
#define REAL(x) ((roln_real)(x))
#define SIGN_BIT ((roln_bits)1 << (8 * sizeof(roln_bits) - 1))

static roln_bits bits(roln_real x)
{
    roln_bits b;
    memcpy(&b, &x, sizeof b);
    return b;
}

static roln_real real(roln_bits b)
{
    roln_real x;
    memcpy(&x, &b, sizeof x);
    return x;
}

static int same(roln_real a, roln_real b)
{
    return bits(a) == bits(b) || (a != a && b != b);
}

/* Distance of y from ref in units of the last place of ref; NaN and Inf must be met exactly (or be one ulp off the end). */
static double ulps(roln_real y, wide ref)
{
    wide end = REF(ldexp)((wide)1, 3 - MIN_EXP), yw = (wide)y, d; /* the first power of two that overflows: 2^128, 2^1024 */
    int64_t e;
    uint64_t b;
    double r = (double)ref;
    if (ref != ref) return y != y ? 0 : 1e30;
    if (ref >= end) return yw > 0 && !roln_finite(y) ? 0 : 1e30;
    if (ref <= -end) return yw < 0 && !roln_finite(y) ? 0 : 1e30;
    if (y != y) return 1e30;
    if (!roln_finite(y)) yw = y > 0 ? end : -end;
    d = yw - ref;
    memcpy(&b, &r, sizeof b); /* exponent of ref, by bits: frexp is too slow for 2^32 of them */
    e = (int64_t)((b >> 52) & 0x7ff) - 1022;
    if (e < MIN_EXP) e = MIN_EXP;
    e = e - MANT_DIG;
    if (e > -1022) {
        b = (uint64_t)(1023 - e) << 52;
        memcpy(&r, &b, sizeof b);
        d = d * (wide)r;
    } else d = REF(ldexp)(d, (int)-e);
    return (double)(d < 0 ? -d : d);
}

static wide ref_softplus(wide x)
{
    return x > 0 ? x + REF(log1p)(REF(exp)(-x)) : REF(log1p)(REF(exp)(x));
}

static wide ref_sigmoid(wide x)
{
    wide e = REF(exp)(x < 0 ? x : -x);
    return (x < 0 ? e : 1) / (1 + e);
}

static wide ref_sinhc(wide x)
{
    wide y = REF(sinh)(x);
    return x == 0 ? 1 : y - y != 0 ? (x < 0 ? -y : y) : y / x;
}

typedef struct { double ulp; roln_real at; } worst;

enum { EXP, EXPM1, LOG, LOG1P, SINHC, SOFTPLUS, SIGMOID, TANH, COUNT };

static const char *const name[COUNT] = {"exp", "expm1", "log", "log1p", "sinhc", "softplus", "sigmoid", "tanh"};

static void see(worst *w, roln_real x, roln_real y, wide ref)
{
    double u = ulps(y, ref);
    if (u > w->ulp) {
        w->ulp = u;
        w->at = x;
    }
}

static void one(worst *w, int f, roln_real x)
{
    wide v = (wide)x;
    switch (f) {
    case EXP: see(w, x, roln_exp(x), REF(exp)(v)); break;
    case EXPM1: see(w, x, roln_expm1(x), REF(expm1)(v)); break;
    case LOG: see(w, x, roln_log(x), REF(log)(v)); break;
    case LOG1P: see(w, x, roln_log1p(x), REF(log1p)(v)); break;
    case SINHC: see(w, x, roln_sinhc(x), ref_sinhc(v)); break;
    case SOFTPLUS: see(w, x, roln_softplus(x), ref_softplus(v)); break;
    case TANH: see(w, x, roln_tanh(x), REF(tanh)(v)); break;
    default: see(w, x, roln_sigmoid(x), ref_sigmoid(v)); break;
    }
}

/* Every step-th number from lo to hi, both of one sign, and hi; of a sample every 97th of them. */
static void range(worst *w, int f, roln_real lo, roln_real hi, roln_bits step)
{
    roln_bits a = bits(lo), b = bits(hi), i;
    if (check_sample) step *= 97;
    if (a > b) { i = a; a = b; b = i; }
    for (i = a; i < b && b - i >= step; i += step) one(w, f, real(i));
    one(w, f, real(i));
    one(w, f, real(b));
}

static void both(worst *w, int f, roln_real lo, roln_real hi, roln_bits step)
{
    range(w, f, lo, hi, step);
    range(w, f, -lo, -hi, step);
}

#ifndef ROLN_DOUBLE
/* Every float where the function is neither x, 1, 0, Inf nor NaN to rounding; elsewhere every 37th or 9973rd. */
static void sweep(worst *w)
{
    static const struct { int f; float lo, hi; } every[] = {
        {EXP, -0.01f, -105.0f},     {EXP, 0.01f, 90.0f},
        {EXPM1, -0.01f, -20.0f},    {EXPM1, 0.01f, 90.0f},
        {LOG, 0.25f, 4.0f},
        {LOG1P, -1e-4f, -1.0f},     {LOG1P, 1e-4f, 16.0f},
        {SINHC, 0.01f, 95.0f},
        {SOFTPLUS, -0.01f, -105.0f},{SOFTPLUS, 0.01f, 20.0f},
        {SIGMOID, -0.01f, -105.0f}, {SIGMOID, 0.01f, 20.0f},
        {TANH, 1e-4f, 10.0f}
    };
    const float inf = real(0x7f800000);
    size_t i;
    int f;
    for (i = 0; i < sizeof every / sizeof *every; i++)
        range(&w[every[i].f], every[i].f, every[i].lo, every[i].hi, 1);
    for (f = 0; f < COUNT; f++) {
        both(&w[f], f, 0, 1e-9f, 9973);
        both(&w[f], f, 1e-9f, 128.0f, 37);
        both(&w[f], f, 128.0f, inf, f == LOG || f == LOG1P ? 37 : 9973);
        both(&w[f], f, inf, real(0x7fffffff), 9973); /* NaN */
    }
}
#else
/* Uniform points on several scales, every binade, neighbours of powers of two, of range ends and of multiples of ln 2 / 2. */
static void sweep(worst *w)
{
    static const roln_real scale[] = {1e-3, 0.5, 1, 2, 8, 40, 750, 1500};
    uint64_t seed = 1;
    int f, i, j;
    for (f = 0; f < COUNT; f++) {
        for (i = 0; i < 1000000; i++) {
            roln_real u = REAL(2) * roln_uniform(&seed) - REAL(1) + REAL(1e-8) * roln_uniform(&seed);
            one(&w[f], f, (f == LOG) + u * scale[i % 8]);
            if (i % 4 == 0) one(&w[f], f, real(roln_rand(&seed)));
        }
        for (i = -1074; i < 1024; i++)
            for (j = -8; j <= 8; j++) {
                roln_bits b = bits(ldexp(1.0, i));
                if (b < 8) b += 8;
                one(&w[f], f, real(b + (roln_bits)(int64_t)j));
                one(&w[f], f, -real(b + (roln_bits)(int64_t)j));
            }
        for (i = -2200; i <= 2200; i++)
            for (j = -8; j <= 8; j++) {
                if (i != 0) one(&w[f], f, real(bits(0.5 * 0.69314718055994531 * i) + (roln_bits)(int64_t)j));
                if (i != 0) one(&w[f], f, real(bits(i / 6.0) + (roln_bits)(int64_t)j));
            }
        both(&w[f], f, 0, real(ROLNI_INF), UINT64_C(0x7ff0000000000000) / 100000);
        both(&w[f], f, 700, 760, UINT64_C(0xffffffffff));
        both(&w[f], f, real(ROLNI_INF), real(~SIGN_BIT), UINT64_C(0xfffffffffffff) / 100);
    }
}
#endif

static void special(void)
{
    const roln_real inf = REAL(HUGE_VAL), nan = real((roln_bits)~SIGN_BIT), zero = REAL(0), one_ = REAL(1);
    const roln_real small = real(1), low = REAL(-1) * inf;
    CHECK(same(roln_exp(zero), one_) && same(roln_exp(-zero), one_));
    CHECK(same(roln_exp(inf), inf) && same(roln_exp(low), zero) && same(roln_exp(REAL(1e30)), inf) &&
          same(roln_exp(REAL(-1e30)), zero));
    CHECK(same(roln_expm1(zero), zero) && same(roln_expm1(-zero), -zero) && same(roln_expm1(-small), -small));
    CHECK(same(roln_expm1(inf), inf) && same(roln_expm1(low), -one_));
    CHECK(same(roln_log(one_), zero) && same(roln_log(zero), low) && same(roln_log(-zero), low) && same(roln_log(inf), inf));
    CHECK(same(roln_log(-one_), nan) && same(roln_log(low), nan) && same(roln_log(-small), nan));
    CHECK(same(roln_log1p(zero), zero) && same(roln_log1p(-zero), -zero) && same(roln_log1p(small), small) &&
          same(roln_log1p(-small), -small));
    CHECK(same(roln_log1p(-one_), low) && same(roln_log1p(REAL(-1.5)), nan) && same(roln_log1p(inf), inf) &&
          same(roln_log1p(low), nan));
    CHECK(same(roln_sinhc(zero), one_) && same(roln_sinhc(-zero), one_) && same(roln_sinhc(inf), inf) &&
          same(roln_sinhc(low), inf));
    CHECK(same(roln_softplus(inf), inf) && same(roln_softplus(low), zero) && same(roln_softplus(REAL(1e30)), REAL(1e30)));
    CHECK(same(roln_sigmoid(inf), one_) && same(roln_sigmoid(low), zero) && same(roln_sigmoid(zero), REAL(0.5)));
    CHECK(same(roln_exp(nan), nan) && same(roln_exp(-nan), nan) && same(roln_expm1(nan), nan) && same(roln_log(nan), nan) &&
          same(roln_log(-nan), nan));
    CHECK(same(roln_log1p(nan), nan) && same(roln_sinhc(nan), nan) && same(roln_softplus(nan), nan) &&
          same(roln_softplus(-nan), nan));
    CHECK(same(roln_sigmoid(nan), nan) && same(roln_sigmoid(-nan), nan));
    CHECK(same(roln_tanh(inf), one_) && same(roln_tanh(low), -one_) && same(roln_tanh(-zero), -zero) && same(roln_tanh(nan), nan));
}

/* The array form has the bits of the scalar form, in any length, in place or not, and writes nothing else. */
static void array(void)
{
    enum { N = 1021 };
    static roln_real a[N + 1], y[N + 1], s[N + 1];
    uint64_t seed = 7;
    long differ = 0, stray = 0;
    int i, k, n;
    for (k = 0; k < 400; k++) {
        int inplace = k & 1;
        for (i = 0; i <= N; i++) {
            a[i] = (k & 2) ? real((roln_bits)roln_rand(&seed)) : REAL(8) * roln_normal(&seed);
            y[i] = inplace ? a[i] : REAL(3);
            s[i] = REAL(5);
        }
        n = k < 100 ? k : N;
        roln_softplus_n(n, inplace ? y : a, y, s);
        for (i = 0; i < n; i++)
            differ += !same(y[i], roln_softplus(a[i])) || !same(s[i], roln_sigmoid(a[i]));
        stray += !same(y[n], inplace ? a[n] : REAL(3)) || s[n] != REAL(5);
    }
    CHECK(differ == 0);
    CHECK(stray == 0);
}

/* Along a fine grid no function falls by more than rounding (two ulp), and sinhc is even. */
static void shape(void)
{
    roln_real last[COUNT] = {0}, y[COUNT], x;
    long falls = 0, odd = 0;
    int i, f;
    for (i = 1; i < 400000; i++) {
        x = REAL(i) * REAL(1e-4);
        y[EXP] = roln_exp(x);
        y[EXPM1] = roln_expm1(x);
        y[LOG] = roln_log(x);
        y[LOG1P] = roln_log1p(x);
        y[SINHC] = roln_sinhc(x);
        y[SOFTPLUS] = roln_softplus(x);
        y[SIGMOID] = roln_sigmoid(x);
        y[TANH] = roln_tanh(x);
        for (f = 0; f < COUNT; f++) {
            roln_real a = last[f] < 0 ? -last[f] : last[f];
            falls += i > 1 && y[f] < last[f] - REAL(2) * ROLN_EPS * a;
            last[f] = y[f];
        }
        odd += !same(y[SINHC], roln_sinhc(-x)) || !same(y[TANH], -roln_tanh(-x));
    }
    CHECK(falls == 0);
    CHECK(odd == 0);
}

/* Sine, cosine and wrapped angles, in eps: where turns are exact, and beyond. */
static void angles(void)
{
    static const struct { double top, sine, turn; } scale[] = {
        {0.8, 0.7, 0}, {3.15, 0.7, 1}, {30, 0.7, 1}, {3000, 0.7, 1.3},
        {1048576, BOUND(270000, 1), BOUND(270000, 300)}}; /* 300: of 2 pi in long double */
    const roln_real pi = REAL(3.14159265358979323846), inf = REAL(HUGE_VAL), end = REAL(1048576);
    const roln_real odd[4] = {inf, -inf, real((roln_bits)~SIGN_BIT), real(bits(end) + 1)};
    const wide turn = 8 * REF(atan)((wide)1);
    const int points = check_sample ? 20000 : 2000000;
    uint64_t seed = 3;
    roln_real s, c;
    int k, i;
    for (k = 0; k < 5; k++) {
        double sine = 0, off = 0, outside = 0, moved = 0;
        for (i = 0; i < points; i++) {
            const roln_real x = REAL(scale[k].top) * (REAL(2) * roln_uniform(&seed) - REAL(1)), y = roln_wrap(x);
            const wide v = (wide)x, d = REF(remainder)((wide)y - v, turn);
            double e;
            roln_sincos(x, &s, &c);
            e = (double)REF(fmax)(REF(fabs)((wide)s - REF(sin)(v)), REF(fabs)((wide)c - REF(cos)(v)));
            sine = e > sine ? e : sine;
            off = (double)REF(fabs)(d) > off ? (double)REF(fabs)(d) : off;
            outside += !(y > -pi && y <= pi), moved += x > -pi && x <= pi && !same(x, y);
        }
        CHECK_BELOW(sine / (double)ROLN_EPS, scale[k].sine);
        CHECK_BELOW(off / (double)ROLN_EPS, scale[k].turn);
        CHECK(outside <= 0 && moved <= 0);
    }
    {
        double off = 0;
        for (k = 1; k < 333000; k += 2) { /* where rounding decides between two turns */
            const roln_real x = (k % 4 == 1 ? pi : -pi) * (roln_real)k;
            off = fmax(off, (double)REF(fabs)(REF(remainder)((wide)roln_wrap(x) - (wide)x, turn)));
        }
        CHECK_BELOW(off / (double)ROLN_EPS, scale[4].turn);
    }
    for (k = 0; k < 4; k++) {
        roln_sincos(odd[k], &s, &c);
        CHECK(s != s && c != c && roln_wrap(odd[k]) != roln_wrap(odd[k]));
    }
    for (k = 0; k < 2; k++) {
        roln_sincos(k ? end : -end, &s, &c);
        CHECK(roln_finite(s) && roln_finite(c) && roln_finite(roln_wrap(k ? end : -end)));
    }
    roln_sincos(0, &s, &c);
    CHECK(same(s, 0) && same(c, 1) && same(roln_wrap(pi), pi) && roln_wrap(-pi) > REAL(3.14159) && same(roln_wrap(0), 0));
}

/* ---- divided differences and powers ---- */

/* Errors of two numbers x < y and an exponent p: of exp[x, y] in ulp; of x^p in (1 + |p log x|) eps; of f[x, y] in eps, of powers
   that are made by exp and log in (1 + max |p log|) eps. found: what the search below comes to, rounded up; proved: the sum of the
   parts' bounds, which stands in roln_spd.h. */
enum { DD1_EXP, VALUES, DD1_LOG, DD1_HALF, DD1_INVERSE_ROOT, DD1_INVERSE, DD1_SQUARE, DD1_POWER, ERRORS };
static const struct {
    const char *name;
    double p, found, proved;
} errors[ERRORS] = {{"exp[x, y]", 0, 5.2, 7}, {"x^p", 0, 1.4, 2}, {"log[x, y]", 0, 2.3, 3}, {"1/2", 0.5, 1.5, 1.6},
                    {"-1/2", -0.5, 3.8, 5}, {"-1", -1, 1.55, 1.6}, {"2", 2, 4.2, 7}, {"p", 0, 5, 11}};

static wide power_of(roln_real x, roln_real p)
{
    return (wide)powl((long double)x, (long double)p);
}

/* 0 outside of what is asked of the function; powers and their arguments are no denormal numbers. */
static double error_of(int k, const roln_real *v)
{
    const roln_real a = v[0], b = v[1], p = k == VALUES || k == DD1_POWER ? v[2] : REAL(errors[k].p);
    const wide A = (wide)a, gap = (wide)b - A, size = BOUND(40, 300);
    roln_real f[2], K[4];
    wide la, lb, want, t;
    if (!roln_all_finite(3, v)) return 0;
    if (k == DD1_EXP) {
        if (!(a < b) || a < REAL(-40) || b > REAL(40)) return 0;
        roln_exp_dd1(2, v, K);
        return ulps(K[1], REF(exp)(A) * REF(expm1)(gap) / gap);
    }
    if (!(a > REAL(1e-12)) || !(b < REAL(1e12))) return 0;
    la = (wide)p * REF(log)(A), lb = (wide)p * REF(log)((wide)b);
    if (!(REF(fabs)(la) < size) || !(REF(fabs)(lb) < size)) return 0;
    t = 1 + REF(fmax)(REF(fabs)(la), REF(fabs)(lb));
    if (k == VALUES) {
        if (roln_map_values(1, ROLN_POWER, p, v, f) != ROLN_OK) return 1e30;
        want = power_of(a, p);
        return (double)(REF(fabs)((wide)f[0] - want) / want / (wide)ROLN_EPS / (1 + REF(fabs)(la)));
    }
    if (!(a < b) || b > 400 * a || (k == DD1_POWER && ((p >= 0 && p <= 0) || (p >= 1 && p <= 1)))) return 0;
    if (roln_map_values(2, k == DD1_LOG ? ROLN_LOG : ROLN_POWER, p, v, f) != ROLN_OK) return 1e30;
    roln_map_dd1(2, k == DD1_LOG ? ROLN_LOG : ROLN_POWER, p, v, f, K);
    want = REF(log1p)(gap / A);
    if (k != DD1_LOG) want = REF(expm1)((wide)p * want) * power_of(a, p);
    want /= gap;
    return (double)(REF(fabs)(((wide)K[1] - want) / want) / (wide)ROLN_EPS / (k == DD1_POWER ? t : 1));
}

/* x, changed in a digit of any weight. */
static roln_real nudged(roln_real x, uint64_t *s)
{
    const double weight = ldexp(1, -roln_randint(MANT_DIG, s));
    return x * (REAL(1) + REAL(weight) * (REAL(2) * roln_uniform(s) - REAL(1)));
}

/* From `climbs` random places, near each other and far: changes that make the error no smaller are kept. The worst, and where. */
static double climb(int k, int climbs, int changes, uint64_t *s, roln_real *at)
{
    double top = 0;
    int c, i;
    for (c = 0; c < climbs; c++) {
        roln_real v[3], w[3];
        double e, now;
        const double u = (double)roln_uniform(s), far = (double)roln_uniform(s);
        if (k == DD1_EXP) {
            v[0] = REAL(76 * u - 38);
            v[1] = v[0] + REAL(c % 3 == 0 ? 1 + far / 2 : c % 3 == 1 ? far : exp(8 * far - 6));
        } else {
            v[0] = REAL(exp((c % 2 ? 4 : 40) * (u - 0.5)));
            v[1] = v[0] * REAL(1 + (c % 3 == 0 ? exp(-14 * far) : c % 3 == 1 ? 2 * far : exp(6 * far)));
        }
        v[2] = REAL(c % 5 == 0 ? 30 : c % 5 == 1 ? 3 : 1) * (REAL(2) * roln_uniform(s) - REAL(1));
        e = error_of(k, v);
        for (i = 0; i < changes; i++) {
            const int what = roln_randint(4, s);
            memcpy(w, v, sizeof w);
            if (what != 1) w[0] = nudged(w[0], s);
            if (what != 0) w[1] = nudged(w[1], s);
            if (what == 3) w[2] = nudged(w[2], s);
            if ((now = error_of(k, w)) >= e) e = now, memcpy(v, w, sizeof v);
        }
        if (e > top) top = e, memcpy(at, v, sizeof v);
    }
    return top;
}

static void test_dd1(void)
{
    uint64_t s = 21;
    int k;
    for (k = 0; k < ERRORS; k++) {
        roln_real at[3] = {0, 0, 0};
        const double top = check_sample ? climb(k, 60, 300, &s, at) : climb(k, 600, 1500, &s, at);
        printf("  %-10s %-6s worst %.3f at %.17g, %.17g, p = %.17g\n", errors[k].name, TEST_PRECISION, top, (double)at[0],
               (double)at[1], k == VALUES || k == DD1_POWER ? (double)at[2] : errors[k].p);
        CHECK_BELOW(top, errors[k].found);
        CHECK(errors[k].found <= errors[k].proved && top > errors[k].found / 2);
    }
}

void TEST_NAME(elementary)(void);
void TEST_NAME(elementary)(void)
{
    worst w[COUNT];
    int f;
    memset(w, 0, sizeof w);
    special();
    array();
    shape();
    angles();
    test_dd1();
    sweep(w);
    for (f = 0; f < COUNT; f++)
        printf("  %-8s %-6s worst %.3f ulp at %.17g\n", name[f], TEST_PRECISION, w[f].ulp, (double)w[f].at);
    CHECK_BELOW(w[EXP].ulp, 1.0);
    CHECK_BELOW(w[EXPM1].ulp, BOUND(1.4, 1.3));
    CHECK_BELOW(w[LOG].ulp, BOUND(1.0, 1.4));
    CHECK_BELOW(w[LOG1P].ulp, BOUND(1.4, 1.3));
    CHECK_BELOW(w[SINHC].ulp, 2.5);
    CHECK_BELOW(w[SOFTPLUS].ulp, 2.1);
    CHECK_BELOW(w[SIGMOID].ulp, 2.5);
    CHECK_BELOW(w[TANH].ulp, 3.6);
}
