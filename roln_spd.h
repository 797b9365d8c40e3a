/* SPDX-License-Identifier: MIT */
/* roln_spd.h - the ground floor of roln: numbers, vectors, symmetric positive-definite (SPD) matrices.

   1 configuration      scalar type, qualifiers, version, scratch
   2 status             what a function can report; finite numbers; copy and zero
   3 random numbers     splitmix64, the same bits everywhere
   4 elementary         exp, expm1, log, log1p, sinhc, softplus, sigmoid, tanh, sine and cosine, angles
   5 dense kernels      matrix products, Cholesky, small inverse, triangle of a matrix
   6 eigensolver        symmetric, any n, scaled, bounded
   7 SPD maps           exp, log, powers at any base point: value, derivative, backward; second derivative of exp
   8 SPD geometry       the affine-invariant distance
   9 polynomials        products of Chebyshev polynomials, their derivatives and backward

   Names: what begins with roln_ or ROLN_ is for users. What begins with rolni_ or ROLNI_ is shared among the five headers, may
   change with every version, and is promised to nobody else.
   Matrices are row-major. Arguments come in the order: the object or model, sizes, const inputs, in-and-outs, outputs, work.
   Work is the caller's memory, in units of roln_real, its size given by the macro above the function.
   Nothing here allocates, recurses, prints or keeps state. Functions from outside: sqrt, fabs (an instruction, unless
   -fno-builtin forbids it), memcpy, memmove, memset. */

#ifndef ROLN_SPD_H
#define ROLN_SPD_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* ---- 1 configuration ------------------------------------------------------------------------- */

/* The release that this is, or, with -dev, the one that comes next: CHANGELOG.md. All packages take their number from here. */
#define ROLN_VERSION_MAJOR 0
#define ROLN_VERSION_MINOR 4
#define ROLN_VERSION_PATCH 0
#define ROLN_VERSION "0.4.0"

/* Scalar type: float, or double where ROLN_DOUBLE is defined, before the first header of roln. Everything is static, so one program
   may hold both in two translation units. ROLN_C(x) writes a constant in that type. */
#ifdef ROLN_DOUBLE
#define ROLNI_DOUBLE
typedef double roln_real;
typedef uint64_t roln_bits;
#define ROLN_C(x) x
#define ROLN_EPS 2.2204460492503131e-16
#define ROLN_SQRT(x) sqrt(x)
#define ROLN_ABS(x) fabs(x)
#else
typedef float roln_real;
typedef uint32_t roln_bits;
#define ROLN_C(x) x##f
#define ROLN_EPS 1.1920929e-7f
#define ROLN_SQRT(x) sqrtf(x)
#define ROLN_ABS(x) fabsf(x)
#endif

/* Where code and weights lie: ROLN_CODE stands before every function, ROLN_FLASH before the weights that NAME_write writes.
       #define ROLN_CODE __attribute__((section(".itcm")))
       #define ROLN_FLASH __attribute__((section(".qspi"))) */
#ifndef ROLN_CODE
#define ROLN_CODE
#endif
#ifndef ROLN_FLASH
#define ROLN_FLASH
#endif

/* 1: attributes, builtins and vectors of GNU C. clang for windows-msvc has them, but does not define __GNUC__. */
#if defined(__GNUC__) || defined(__clang__)
#define ROLNI_GNU 1
#else
#define ROLNI_GNU 0
#endif

/* ROLN_FN: linkage of every function, without a warning where one is not used. Override it (static inline, always_inline) to trade
   size for speed, with ROLN_CODE in it:
       #define ROLN_FN ROLN_CODE static inline */
#ifndef ROLN_FN
#if ROLNI_GNU
#define ROLN_FN ROLN_CODE static __attribute__((__unused__))
#else
#define ROLN_FN ROLN_CODE static inline
#endif
#endif

/* Small functions that are always inlined, and a copy of one number that is one move, under -ffreestanding too. */
#if ROLNI_GNU
#define ROLNI_INLINE static inline __attribute__((__always_inline__))
#define ROLNI_COPY __builtin_memcpy
#else
#define ROLNI_INLINE ROLN_CODE static inline
#define ROLNI_COPY memcpy
#endif

/* Linkage of constant tables: no warning where one is not used. */
#if ROLNI_GNU
#define ROLNI_TABLE static const __attribute__((__unused__))
#else
#define ROLNI_TABLE static const
#endif

/* 1: kernels for the float vectors of Arm Helium (MVE). These vectors take denormal numbers for 0, whatever FPSCR says, and
   raise a flag of FPSCR: IDC for an operand, UFC for a result. A kernel that finds a flag leaves its numbers to the plain C
   behind it. So the bits are those of plain C. The flags are cleared on the way. Defining ROLN_SIMD, as 0 or 1, leaves these
   kernels out. */
#if ROLNI_GNU && defined(__ARM_FEATURE_MVE) && __ARM_FEATURE_MVE & 2 && !defined(ROLN_DOUBLE) && !defined(ROLN_SIMD)
#define ROLNI_MVE 1
#include <arm_mve.h>
#else
#define ROLNI_MVE 0
#endif

/* Sizes are ints, of 32 bits or more. */
typedef char rolni_int_has_32_bits[sizeof(int) >= 4 ? 1 : -1];

#define ROLN_MAX(a, b) ((a) > (b) ? (a) : (b))
#define ROLN_MIN(a, b) ((a) < (b) ? (a) : (b))

#ifdef __cplusplus
#define ROLN_RESTRICT __restrict
#define ROLNI_AS(type, x) static_cast<type>(x)
#else
#define ROLN_RESTRICT restrict
#define ROLNI_AS(type, x) ((type)(x))
#endif

/* Scratch is the caller's memory, `work`, in units of roln_real. What a function takes of it stands once, as a list of arrays
   above the function, X(name, how many numbers). X says what to make of an array: ROLNI_SIZE "+ size", ROLNI_CARVE a local pointer
   that is cut from work. So the same list gives the size at compile time and the arrays at run time:
       #define ROLN_FOO_MEM(X, n) X(A, (n) * (n)) X(b, n)
       #define ROLN_FOO_WORK(n)   (0 ROLN_FOO_MEM(ROLNI_SIZE, n) + what the hungriest function below takes)
       ...
       ROLN_FOO_MEM(ROLNI_CARVE, n)    in the function: declares A and b, and moves work on to what is left */
#define ROLNI_SIZE(name, size) +(size)
#define ROLNI_CARVE(name, size) roln_real *const name = (work += (size)) - (size);
/* A list may also be the members of a struct, placed in *b. Lists that depend on the whole shape of a model ask S for sizes by
   name: in a function S is ROLNI_LOCAL, and S(n) is its local int n; in the typed shell of roln.h S(n) is the constant NAME_n. */
#define ROLNI_FIELD(name, size) roln_real *name;
#define ROLNI_LAY(name, size) b->name = work, work += (size);
#define ROLNI_LOCAL(x) x

/* An array parameter of n numbers or more: in C, compilers warn where a shorter one is passed. */
#ifdef __cplusplus
#define ROLN_AT_LEAST(n) n
#else
#define ROLN_AT_LEAST(n) static n
#endif

/* clang contracts a*b+c to a fused multiply-add unless told not to; gcc does not under -std=c99.
   With contraction off the same program gives the same bits on every target that computes float in float (FLT_EVAL_METHOD 0)
   and keeps denormal numbers: not x87, AltiVec without VSX, nor clang with -mfpu=neon on armv7; gcc on s390x needs
   -fexcess-precision=fast. On Arm with Helium (MVE) the compiler must not vectorise loops by itself: -fno-tree-vectorize, clang
   -fno-vectorize -fno-slp-vectorize. */
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF
#endif

/* ---- 2 status -------------------------------------------------------------------------------- */

/* A function that returns a status writes its outputs only when it returns ROLN_OK, unless it says otherwise. */
typedef enum {
    ROLN_OK = 0,                 /* Done. */
    ROLN_E_NOT_FINITE = -1,      /* An input or a result is NaN or infinite. */
    ROLN_E_NOT_SPD = -2,         /* A matrix that must be positive definite is not, to working precision. */
    ROLN_E_NO_CONVERGENCE = -3,  /* An iteration reached its bound. */
    ROLN_E_ILL_CONDITIONED = -4, /* An inverse or a retraction would lose all digits. */
    ROLN_E_RANGE = -5,           /* A number is beyond what its type can hold, or outside its allowed range. */
    ROLN_E_LENGTH = -6,          /* Data has a wrong number of bytes, or a count is too small or too large. */
    ROLN_E_FORMAT = -7,          /* Data is not in the format of this version. */
    ROLN_E_PRECISION = -8,       /* Data holds float where double is read, or double where float is read. */
    ROLN_E_SHAPE = -9,           /* Data belongs to a model of other sizes or options. */
    ROLN_E_CHECKSUM = -10        /* Data is damaged. */
} roln_status;

/* Returns the name of a status and one sentence about it, "ROLN_E_CHECKSUM: Data is damaged.". A number that is no status gives
   "unknown status". The texts are linked only into programs that call this function (test_safety.c: test_texts). */
ROLN_FN const char *roln_status_text(int status)
{
    static const char *const text[] = {
        "ROLN_OK: Done.",
        "ROLN_E_NOT_FINITE: An input or a result is NaN or infinite.",
        "ROLN_E_NOT_SPD: A matrix that must be positive definite is not, to working precision.",
        "ROLN_E_NO_CONVERGENCE: An iteration reached its bound.",
        "ROLN_E_ILL_CONDITIONED: An inverse or a retraction would lose all digits.",
        "ROLN_E_RANGE: A number is beyond what its type can hold, or outside its allowed range.",
        "ROLN_E_LENGTH: Data has a wrong number of bytes, or a count is too small or too large.",
        "ROLN_E_FORMAT: Data is not in the format of this version.",
        "ROLN_E_PRECISION: Data holds float where double is read, or double where float is read.",
        "ROLN_E_SHAPE: Data belongs to a model of other sizes or options.",
        "ROLN_E_CHECKSUM: Data is damaged.",
    };
    return status <= 0 && status >= ROLN_E_CHECKSUM ? text[-status] : "unknown status";
}

/* Nonzero if x is neither NaN nor infinite. Looks at bits: -ffast-math cannot remove it. Under that, clang 19 takes every argument
   for finite and what follows from its bits for known, unless they are read from memory anew. */
ROLN_FN int roln_finite(roln_real x)
{
    roln_bits b;
    memcpy(&b, &x, sizeof b);
#if defined __FINITE_MATH_ONLY__ && __FINITE_MATH_ONLY__ + 0 > 0
    {
        const volatile roln_bits memory = b;
        b = memory;
    }
#endif
#ifdef ROLN_DOUBLE
    return (b & UINT64_C(0x7ff0000000000000)) != UINT64_C(0x7ff0000000000000);
#else
    return (b & UINT32_C(0x7f800000)) != UINT32_C(0x7f800000);
#endif
}

#if ROLNI_MVE
/* Four numbers from and to memory. vldrwq_f32 and vstrwq_f32 of gcc take them for ints: they may read a float before it is
   written. */
typedef roln_real __attribute__((__vector_size__(16), __aligned__(4), __may_alias__)) rolni_four;
ROLNI_INLINE float32x4_t rolni_mve_load(const roln_real *x)
{
    return *ROLNI_AS(const rolni_four *, ROLNI_AS(const void *, x));
}

ROLNI_INLINE void rolni_mve_store(roln_real *x, float32x4_t v)
{
    *ROLNI_AS(rolni_four *, ROLNI_AS(void *, x)) = v;
}
#endif

/* Nonzero if all n numbers of x are finite. */
ROLN_FN int roln_all_finite(int n, const roln_real *x)
{
    int i, bad = 0;
#if ROLNI_MVE
    uint32x4_t most = vdupq_n_u32(0);
    for (; n >= 4; n -= 4, x += 4)
        most = vmaxq_u32(most, vandq_u32(vreinterpretq_u32_f32(rolni_mve_load(x)), vdupq_n_u32(UINT32_C(0x7f800000))));
    bad = vmaxvq_u32(0, most) == UINT32_C(0x7f800000);
#endif
    for (i = 0; i < n; i++)
        bad |= !roln_finite(x[i]);
    return !bad;
}

/* y = x, y = 0, n numbers. */
ROLNI_INLINE void rolni_copy(int n, const roln_real *x, roln_real *y)
{
    memcpy(y, x, ROLNI_AS(size_t, n) * sizeof *y);
}

ROLNI_INLINE void rolni_zero(int n, roln_real *y)
{
    memset(y, 0, ROLNI_AS(size_t, n) * sizeof *y);
}

/* ---- 3 random numbers ------------------------------------------------------------------------ */

/* splitmix64 (Steele, Lea, Flood 2014). The state is one uint64_t in the caller's memory; any value is a seed. */
ROLN_FN uint64_t roln_rand(uint64_t *s)
{
    uint64_t x = (*s += UINT64_C(0x9e3779b97f4a7c15));
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

/* Uniform in [0, 1), 24 bits: exact in float and in double, hence the same numbers in both. */
ROLN_FN roln_real roln_uniform(uint64_t *s)
{
    return ROLNI_AS(roln_real, ROLNI_AS(int32_t, roln_rand(s) >> 40)) * ROLN_C(5.9604644775390625e-8);
}

/* Normal deviate, mean 0, variance 1, as the sum of 12 uniforms minus 6: bounded by 6, no libm, the same bits. */
ROLN_FN roln_real roln_normal(uint64_t *s)
{
    int32_t sum = 0;
    int i;
    for (i = 0; i < 12; i++)
        sum += ROLNI_AS(int32_t, roln_rand(s) >> 40);
    return ROLNI_AS(roln_real, sum - (INT32_C(6) << 24)) * ROLN_C(5.9604644775390625e-8);
}

/* Uniform integer in 0..n-1, n >= 1 (multiply-shift; bias below n / 2^32). */
ROLN_FN int roln_randint(int n, uint64_t *s)
{
    return ROLNI_AS(int, ((roln_rand(s) >> 32) * ROLNI_AS(uint64_t, n)) >> 32);
}

/* Put index[0 .. count-1] in random order (Fisher-Yates): the same order for the same seed everywhere. */
ROLN_FN void roln_shuffle(int count, int *index, uint64_t *seed)
{
    int i;
    for (i = count - 1; i > 0; i--) {
        const int j = roln_randint(i + 1, seed), t = index[i];
        index[i] = index[j];
        index[j] = t;
    }
}

/* ---- 4 elementary functions ------------------------------------------------------------------ */

/* Only + - * / and operations on bits: the same result on every target (contraction off). exp, softplus
   and sigmoid have no branch, so that a loop over them becomes vector code under strict flags; NaN and
   range ends are selected in integers, and rounding goes through int, so -ffast-math leaves them whole.
   roln_log1p and the scalar softplus and sigmoid are here for use without roln.h.
   Worst error in ulp, denormals included (float: every float, make numerics; double: 7 10^7 points, random and at the ends,
   test_elementary.c: sweep):

                 exp   expm1   log    log1p   sinhc   softplus   sigmoid
       float     0.96  1.39    0.98   1.32    2.40    2.06       2.41
       double    0.95  1.23    1.32   1.25    2.37    2.03       2.36

   Worst error of sin and cos in eps: 0.66 for |x| up to 3,000 in float, 0.82 up to 2^20 in double; in float beyond 3,000 what half
   an ulp of x makes (test_elementary.c: angles). tanh: 3.55 ulp. */

/* ln 2 = ROLNI_LN2HI + ROLNI_LN2LO; k * ROLNI_LN2HI is exact, with a bit to spare, for every exponent k. */
#ifdef ROLN_DOUBLE
#define ROLNI_MANT 52
#define ROLNI_BIAS UINT64_C(1023)
#define ROLNI_SIGN UINT64_C(0x8000000000000000)
#define ROLNI_INF UINT64_C(0x7ff0000000000000)
#define ROLNI_LN2HI 0.693146705627441406 /* 726817 / 2^20 */
#define ROLNI_LN2LO 4.74932503903167232e-7
#define ROLNI_EXP_END 746.0 /* exp is 0 below minus this, Inf above */
#else
#define ROLNI_MANT 23
#define ROLNI_BIAS UINT32_C(127)
#define ROLNI_SIGN UINT32_C(0x80000000)
#define ROLNI_INF UINT32_C(0x7f800000)
#define ROLNI_LN2HI 0.693145752f /* 45426 / 2^16 */
#define ROLNI_LN2LO 1.42860682e-6f
#define ROLNI_EXP_END 104.0f
#endif

ROLNI_INLINE roln_bits rolni_bits(roln_real x)
{
    roln_bits b;
    ROLNI_COPY(&b, &x, sizeof b);
    return b;
}

ROLNI_INLINE roln_real rolni_real(roln_bits b)
{
    roln_real x;
    ROLNI_COPY(&x, &b, sizeof x);
    return x;
}

/* All ones if the sign bit of b is set, else 0. */
ROLNI_INLINE roln_bits rolni_mask(roln_bits b)
{
    return ROLNI_AS(roln_bits, 0) - (b >> (8 * sizeof b - 1));
}

/* x = k ln 2 + r, |r| <= ln 2 / 2, for |x| <= ROLNI_EXP_END: e^r = 1 + (h + t), h exact.
   h = x - k hi, r = h - k lo, t = r^2 (u + r v) - k lo, u and v even polynomials (two short chains
   instead of one long). Returns k + 2 bias. */
ROLNI_INLINE roln_bits rolni_exp_split(roln_real x, roln_real *h, roln_real *t)
{
    int32_t n = ROLNI_AS(int32_t, x * ROLN_C(1.4426950408889634) + (ROLN_C(2.0) * ROLNI_AS(roln_real, ROLNI_BIAS) + ROLN_C(0.5)));
    roln_real k = ROLNI_AS(roln_real, n) - ROLN_C(2.0) * ROLNI_AS(roln_real, ROLNI_BIAS);
    roln_real lo = k * ROLNI_LN2LO, hi = k * ROLNI_LN2HI, r, rr, u, v;
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__)
    /* the last bit is 0 already; to clear it keeps -ffast-math from adding k hi and k lo first */
    hi = rolni_real(rolni_bits(hi) & ~ROLNI_AS(roln_bits, 1));
#endif
    *h = x - hi;
    r = *h - lo;
    rr = r * r;
#ifdef ROLN_DOUBLE
    u = 0.50000000000000111 + rr * (4.1666666666530162e-2 + rr * (1.3888888943628945e-3 + rr * (2.480149310007098e-5 +
        rr * 2.7630247990155085e-7)));
    v = 0.16666666666666413 + rr * (8.3333333334944647e-3 + rr * (1.984126950656571e-4 + rr * (2.755758638843295e-6 +
        rr * 2.5000056708160523e-8)));
#else
    u = 0.49999994f + rr * (4.1668389e-2f + rr * 1.38145988e-3f);
    v = 0.166665211f + rr * 8.36871751e-3f;
#endif
    *t = rr * (u + r * v) - lo;
    return ROLNI_AS(roln_bits, n);
}

/* 2 atanh(s) / s - 2 of z = s^2, |s| <= 1/3: z (u + z v), u and v polynomials in z^2. */
ROLNI_INLINE roln_real rolni_atanh_tail(roln_real z)
{
    roln_real zz = z * z, u, v;
#ifdef ROLN_DOUBLE
    u = 0.66666666666666308 + zz * (0.2857142854811856 + zz * (0.18181744481049464 + zz * (0.1330112201913855 +
        zz * 0.083449945676209308)));
    v = 0.40000000000155117 + zz * (0.22222223953598844 + zz * (0.15386548346493306 + zz * (0.12104939690836743 +
        zz * 0.17009713829115114)));
#else
    u = 0.666664183f + zz * 0.280018151f;
    v = 0.400215268f + zz * 0.280119389f;
#endif
    return z * (u + z * v);
}

/* log(1 + f), -1/2 <= f <= 1: s = f / (2 + f), log(1 + f) = 2 atanh(s) = f - s (f - tail(s^2)). */
ROLNI_INLINE roln_real rolni_log1p(roln_real f)
{
    roln_real s = f / (ROLN_C(2.0) + f);
    return f - s * (f - rolni_atanh_tail(s * s));
}

/* e^x = 2^k e^r. 2^k is applied in two halves, the first to the exponent bits, so that denormal results
   are rounded once more and no more. x beyond the ends, NaN too, is clamped by its bits; NaN comes back with 2^k. */
ROLNI_INLINE roln_real rolni_exp(roln_real x)
{
    const roln_bits end = rolni_bits(ROLNI_EXP_END);
    roln_bits b = rolni_bits(x), m = b & ~ROLNI_SIGN, nan = rolni_mask(ROLNI_INF - m), n;
    roln_real h, t, y;
    m = m < end ? m : end;
    n = rolni_exp_split(rolni_real(m | (b & ROLNI_SIGN)), &h, &t);
    y = rolni_real(rolni_bits(ROLN_C(1.0) + (h + t)) + (((n >> 1) - ROLNI_BIAS) << ROLNI_MANT));
    return y * rolni_real((n - (n >> 1)) << ROLNI_MANT | nan);
}

/* e = e^-|a| serves both: softplus = max(a, 0) + log(1 + e), sigmoid = (1 or e) / (1 + e) by the sign of a. */
ROLNI_INLINE void rolni_softplus(roln_real a, roln_real *y, roln_real *s)
{
    roln_bits b = rolni_bits(a), neg = rolni_mask(b);
    roln_real e = rolni_exp(rolni_real(b | ROLNI_SIGN));
    *y = rolni_real(b & ~neg) + rolni_log1p(e);
    *s = rolni_real((rolni_bits(e) & neg) | (rolni_bits(ROLN_C(1.0)) & ~neg)) / (ROLN_C(1.0) + e);
}

/* e^x. */
ROLN_FN roln_real roln_exp(roln_real x)
{
    return rolni_exp(x);
}

/* e^x - 1 = (2^k h + (2^k - 1)) + 2^k t: the first sum is exact where it cancels. */
ROLN_FN roln_real roln_expm1(roln_real x)
{
    roln_bits m = rolni_bits(x) & ~ROLNI_SIGN, n;
    roln_real h, t, p;
    if (m > rolni_bits(ROLN_C(40.0))) return roln_exp(x) - ROLN_C(1.0);
    if (m < rolni_bits(ROLN_EPS)) return x;
    n = rolni_exp_split(x, &h, &t);
    if (n == 2 * ROLNI_BIAS) return h + t;
    p = rolni_real((n - ROLNI_BIAS) << ROLNI_MANT);
    return (p * h + (p - ROLN_C(1.0))) + p * t;
}

/* log x = k ln 2 + log(1 + f), x = 2^k (1 + f), 2/3 <= 1 + f < 4/3. log 0 = -Inf, log of a negative is NaN. */
ROLN_FN roln_real roln_log(roln_real x)
{
    const roln_bits base = rolni_bits(ROLN_C(0.66666667)), one = ROLNI_BIAS << ROLNI_MANT;
    roln_bits b = rolni_bits(x);
    int32_t k = -ROLNI_AS(int32_t, ROLNI_BIAS);
    roln_real f;
    if (b >= ROLNI_INF) {                                              /* NaN, Inf, sign bit set */
        if ((b & ~ROLNI_SIGN) == 0) return rolni_real(ROLNI_SIGN | ROLNI_INF);
        return rolni_real(b > (ROLNI_SIGN | ROLNI_INF) || b < ROLNI_SIGN ? b : ROLNI_INF | (ROLNI_INF >> 1));
    }
    if (b < ROLNI_AS(roln_bits, 1) << ROLNI_MANT) {                              /* 0, denormal */
        if (b == 0) return rolni_real(ROLNI_SIGN | ROLNI_INF);
        b = rolni_bits(x * ROLNI_AS(roln_real, ROLNI_AS(roln_bits, 1) << ROLNI_MANT));
        k -= ROLNI_MANT;
    }
    b += one - base;
    k += ROLNI_AS(int32_t, b >> ROLNI_MANT);
    f = rolni_real((b & ((ROLNI_AS(roln_bits, 1) << ROLNI_MANT) - 1)) + base) - ROLN_C(1.0);
    f = rolni_log1p(f) + ROLNI_AS(roln_real, k) * ROLNI_LN2LO;
    return f + ROLNI_AS(roln_real, k) * ROLNI_LN2HI;
}

/* log(1 + x). For x > 1 with u = 1 + x rounded: log u + (x - (u - 1)) / u. */
ROLN_FN roln_real roln_log1p(roln_real x)
{
    roln_real u = ROLN_C(1.0) + x, c = ROLN_C(0.0);
    if (x >= ROLN_C(-0.5) && x <= ROLN_C(1.0)) return rolni_log1p(x);
    if (x > ROLN_C(1.0) && x < ROLN_C(2.0) / ROLN_EPS) c = (x - (u - ROLN_C(1.0))) / u;
    return roln_log(u) + c;
}

/* sinh(x) / x, even, 1 at 0. With t = e^|x| - 1: (t + t / (t + 1)) / (2 |x|); far out e^(|x| - 8) / |x| * e^8 / 2. */
ROLN_FN roln_real roln_sinhc(roln_real x)
{
    roln_bits m = rolni_bits(x) & ~ROLNI_SIGN;
    roln_real a = rolni_real(m), t;
    if (m < rolni_bits(ROLN_EPS)) return ROLN_C(1.0);
    if (m > rolni_bits(ROLN_C(1000.0))) return roln_exp(a);
    if (m > rolni_bits(ROLN_C(20.0))) { /* the sign bit is 0 already; clearing it keeps -ffast-math from multiplying first */
        t = roln_exp(a - ROLN_C(8.0)) / a;
        return rolni_real(rolni_bits(t) & ~ROLNI_SIGN) * ROLN_C(1490.4789935208641);
    }
    t = roln_expm1(a);
    return (t + t / (t + ROLN_C(1.0))) / (a + a);
}

/* log(1 + e^x), without overflow. */
ROLN_FN roln_real roln_softplus(roln_real x)
{
    roln_real y, s;
    rolni_softplus(x, &y, &s);
    return y;
}

/* 1 / (1 + e^-x) = softplus'(x). With s = roln_sigmoid(x): softplus''(x) = s (1 - s). */
ROLN_FN roln_real roln_sigmoid(roln_real x)
{
    roln_real y, s;
    rolni_softplus(x, &y, &s);
    return s;
}

/* tanh x = -t / (2 + t) with the sign of x, t = e^(-2 |x|) - 1. */
ROLN_FN roln_real roln_tanh(roln_real x)
{
    const roln_bits b = rolni_bits(x), sign = b & ROLNI_SIGN;
    const roln_real t = roln_expm1(ROLN_C(-2.0) * rolni_real(b & ~ROLNI_SIGN));
    return rolni_real((rolni_bits(t / (ROLN_C(2.0) + t)) & ~ROLNI_SIGN) | sign);
}

#if ROLNI_MVE
/* Kernels that need most registers are not inlined. */
#define ROLNI_MVE_FN ROLN_FN __attribute__((__noinline__))

/* Clears IDC and UFC. Numbers that are read after the call, at the returned pointer x or elsewhere, are used after that. */
ROLNI_INLINE const roln_real *rolni_mve_begin(const roln_real *x)
{
    uint32_t flags;
    __asm__ volatile("vmrs %0, fpscr\n\tbic %0, %0, #0x88\n\tvmsr fpscr, %0" : "=&r"(flags), "+r"(x) : : "memory");
    return x;
}

/* Nothing that leads to *v comes after a call of rolni_mve_denormal that follows. No instruction. */
ROLNI_INLINE void rolni_mve_end(float32x4_t *v)
{
    __asm__ volatile("" : "+w"(*v));
}

/* Nonzero if IDC or UFC was raised since rolni_mve_begin. */
ROLNI_INLINE uint32_t rolni_mve_denormal(void)
{
    uint32_t flags;
    __asm__ volatile("vmrs %0, fpscr" : "=r"(flags));
    return flags & 0x88;
}

/* The four numbers at *x, which moves on by 4 or 8: one instruction. The compiler would count in other ways, and add some. */
#define ROLNI_MVE_NEXT(v, x, bytes) \
    __asm__("vldrw.32 %q0, [%1], #" #bytes : "=w"(v), "+r"(*(x)) : "m"(*ROLNI_AS(const rolni_four *, ROLNI_AS(const void *, *(x)))))
ROLNI_INLINE float32x4_t rolni_mve_next4(const roln_real **x)
{
    float32x4_t v;
    ROLNI_MVE_NEXT(v, x, 16);
    return v;
}

ROLNI_INLINE float32x4_t rolni_mve_next8(const roln_real **x)
{
    float32x4_t v;
    ROLNI_MVE_NEXT(v, x, 32);
    return v;
}

/* rolni_exp of -|a|, |a| <= 87, so that the result is no denormal number: 2^k is applied at once. t: rolni_mve_softplus */
ROLNI_INLINE float32x4_t rolni_mve_exp(float32x4_t a, const roln_real *t)
{
    const float32x4_t x = vnegq_f32(vabsq_f32(a));
    const int32x4_t n = vcvtq_s32_f32(vaddq_n_f32(vmulq_n_f32(x, t[0]), t[1]));
    const float32x4_t k = vsubq_n_f32(vcvtq_f32_s32(n), t[2]), h = vsubq_f32(x, vmulq_n_f32(k, t[3]));
    const float32x4_t lo = vmulq_n_f32(k, t[4]), r = vsubq_f32(h, lo), rr = vmulq_f32(r, r);
    const float32x4_t u = vaddq_n_f32(vmulq_f32(rr, vaddq_n_f32(vmulq_n_f32(rr, t[5]), t[6])), t[7]);
    const float32x4_t v = vmulq_f32(r, vaddq_n_f32(vmulq_n_f32(rr, t[8]), t[9]));
    const float32x4_t y = vaddq_n_f32(vaddq_f32(h, vsubq_f32(vmulq_f32(rr, vaddq_f32(u, v)), lo)), t[14]);
    const uint32x4_t bits = vaddq_u32(vreinterpretq_u32_f32(y), vshlq_n_u32(vreinterpretq_u32_s32(n), ROLNI_MANT));
    return vreinterpretq_f32_u32(vsubq_n_u32(bits, 2 * ROLNI_BIAS << ROLNI_MANT));
}

/* rolni_softplus of four numbers, y in and out. Returns 0, and writes nothing, if |a| > 87, as NaN is, or a number on the way is
   denormal. The table has the constants of rolni_exp_split and rolni_atanh_tail; the compiler loads them when it needs them.
   Helium does not divide: four scalar divisions do, in the registers of which q0 and q1 are made. */
#define ROLNI_MVE_DIV(x, y) \
    __asm__ volatile("vdiv.f32 s0, s0, s4\n\tvdiv.f32 s1, s1, s5\n\tvdiv.f32 s2, s2, s6\n\tvdiv.f32 s3, s3, s7" : "+w"(x) : "w"(y))
ROLNI_INLINE int rolni_mve_softplus(roln_real *y, roln_real *s)
{
    static const roln_real table[16] = {1.4426950408889634f, 254.5f, 254.0f, ROLNI_LN2HI, ROLNI_LN2LO, 1.38145988e-3f,
                                        4.1668389e-2f, 0.49999994f, 8.36871751e-3f, 0.166665211f,
                                        0.280018151f, 0.666664183f, 0.280119389f, 0.400215268f, 1, 2};
    register float32x4_t f __asm__("q0");
    register float32x4_t below __asm__("q1");
    const roln_real *t = table;
    float32x4_t a = rolni_mve_load(y), e, z, zz, u, v, sum;
    int32x4_t neg;
    __asm__ volatile("" : "+r"(t));
    if (vmaxvq_u32(0, vreinterpretq_u32_f32(vabsq_f32(a))) > rolni_bits(87.0f)) return 0;
    f = e = rolni_mve_exp(a, t), below = vaddq_n_f32(e, t[15]);
    ROLNI_MVE_DIV(f, below);
    z = vmulq_f32(f, f), zz = vmulq_f32(z, z);
    u = vaddq_n_f32(vmulq_n_f32(zz, t[10]), t[11]), v = vmulq_f32(z, vaddq_n_f32(vmulq_n_f32(zz, t[12]), t[13]));
    sum = vsubq_f32(e, vmulq_f32(f, vsubq_f32(e, vmulq_f32(z, vaddq_f32(u, v)))));
    rolni_mve_end(&a), neg = vshrq_n_s32(vreinterpretq_s32_f32(a), 31);
    sum = vaddq_f32(vreinterpretq_f32_s32(vbicq_s32(vreinterpretq_s32_f32(a), neg)), sum);
    rolni_mve_end(&sum);
    f = vreinterpretq_f32_s32(vorrq_s32(vandq_s32(vreinterpretq_s32_f32(e), neg),
                                        vbicq_s32(vreinterpretq_s32_f32(vdupq_n_f32(t[14])), neg)));
    below = vaddq_n_f32(e, t[14]);
    ROLNI_MVE_DIV(f, below);
    if (rolni_mve_denormal()) return 0;
    rolni_mve_store(y, sum), rolni_mve_store(s, f);
    return 1;
}

/* Four numbers at a time; returns how many are done. */
ROLNI_MVE_FN int rolni_mve_softplus_n(int n, roln_real *y, roln_real *s)
{
    int left = n, i;
    (void)rolni_mve_begin(y);
    for (; left >= 4; left -= 4, y += 4, s += 4) {
        if (rolni_mve_softplus(y, s)) continue;
        for (i = 0; i < 4; i++)
            rolni_softplus(y[i], &y[i], &s[i]);
        (void)rolni_mve_begin(y);
    }
    return n - left;
}

/* y = x y or x + y, as far as it can: returns the first of n numbers that is left. */
ROLNI_INLINE int rolni_mve_each(int times, int n, const roln_real *x, roln_real *y)
{
    int i;
    x = rolni_mve_begin(x);
    for (i = 0; i < n - n % 8; i += 8, x += 8, y += 8) {
        const float32x4_t a = rolni_mve_load(x), b = rolni_mve_load(x + 4), c = rolni_mve_load(y), d = rolni_mve_load(y + 4);
        float32x4_t u = times ? vmulq_f32(a, c) : vaddq_f32(a, c), v = times ? vmulq_f32(b, d) : vaddq_f32(b, d);
        rolni_mve_end(&u), rolni_mve_end(&v);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(y, u), rolni_mve_store(y + 4, v);
    }
    return i;
}
#define ROLNI_MVE_EACH(times, n, x, y) rolni_mve_each(times, n, x, y)
#else
#define ROLNI_MVE_EACH(times, n, x, y) 0
#endif

/* y is argument and result, so that no overlap check stands before the vector loop. */
ROLNI_INLINE void rolni_softplus_inplace(int n, roln_real *ROLN_RESTRICT y, roln_real *ROLN_RESTRICT s)
{
    int i;
    for (i = 0; i < n; i++)
        rolni_softplus(y[i], &y[i], &s[i]);
}

/* y = softplus(a), s = sigmoid(a), n elements, bit for bit as roln_softplus and roln_sigmoid. y may be a; no other overlap. */
ROLN_FN void roln_softplus_n(int n, const roln_real *a, roln_real *y, roln_real *s)
{
    if (y != a && n > 0) rolni_copy(n, a, y);
#if ROLNI_MVE
    {
        const int done = rolni_mve_softplus_n(n, y, s);
        n -= done, y += done, s += done;
    }
#endif
    rolni_softplus_inplace(n, y, s);
}

/* x - n pi/2: pi/2 = HI + MID + LO, n HI and n MID exact for |n| < 2^11 (float), 2^20 (double); beyond, off by about as much as
   x is rounded. */
#ifdef ROLN_DOUBLE
#define ROLNI_QUARTER_HI 1.5707963267341256 /* 33 bits */
#define ROLNI_QUARTER_MID 6.077100506303966e-11 /* 33 bits */
#define ROLNI_QUARTER_LO 2.0222662487959506e-21
#else
#define ROLNI_QUARTER_HI 1.57055664f /* 13 bits */
#define ROLNI_QUARTER_MID 2.39670277e-4f /* 13 bits */
#define ROLNI_QUARTER_LO 1.58932547e-8f
#endif
#define ROLNI_PI ROLN_C(3.1415926535897932)
#define ROLNI_ANGLE_END ROLN_C(1048576.0) /* 2^20: no angle beyond */
ROLNI_INLINE roln_real rolni_less_quarters(roln_real x, int32_t n)
{
    const roln_real k = ROLNI_AS(roln_real, n);
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__)
    volatile roln_real y = x - k * ROLNI_QUARTER_HI; /* not to be added in another order */
    y = y - k * ROLNI_QUARTER_MID;
#else
    const roln_real y = (x - k * ROLNI_QUARTER_HI) - k * ROLNI_QUARTER_MID;
#endif
    return y - k * ROLNI_QUARTER_LO;
}

/* Nonzero if |x| <= 2^20: NaN is not. */
ROLNI_INLINE int rolni_is_angle(roln_real x)
{
    return (rolni_bits(x) & ~ROLNI_SIGN) <= rolni_bits(ROLNI_ANGLE_END);
}

/* The integer next to x, |x| < 2^30. */
ROLNI_INLINE int32_t rolni_nearest(roln_real x)
{
    return ROLNI_AS(int32_t, x + (x < 0 ? ROLN_C(-0.5) : ROLN_C(0.5)));
}

/* s = sin x, c = cos x; NaN for |x| > 2^20. x = n pi/2 + r, |r| <= pi/4, sin r and cos r by polynomials. */
ROLN_FN void roln_sincos(roln_real x, roln_real *s, roln_real *c)
{
    roln_real r, rr, sine, cosine;
    int32_t n;
    if (!rolni_is_angle(x)) {
        *s = *c = rolni_real(ROLNI_INF | (ROLNI_INF >> 1));
        return;
    }
    n = rolni_nearest(x * ROLN_C(0.63661977236758134));
    r = rolni_less_quarters(x, n);
    rr = r * r;
#ifdef ROLN_DOUBLE
    sine = -1.66666666666666324e-1 + rr * (8.33333333332248946e-3 + rr * (-1.98412698298579493e-4 + rr * (2.75573137070700677e-6 +
        rr * (-2.50507602534068634e-8 + rr * 1.58969099521155010e-10))));
    cosine = 4.16666666666666019e-2 + rr * (-1.38888888888741096e-3 + rr * (2.48015872894767294e-5 + rr * (-2.75573143513906633e-7 +
        rr * (2.08757232129817483e-9 + rr * -1.13596475577881948e-11))));
#else
    sine = -1.6666654611e-1f + rr * (8.3321608736e-3f + rr * -1.9515295891e-4f);
    cosine = 4.166664568298827e-2f + rr * (-1.388731625493765e-3f + rr * 2.443315711809948e-5f);
#endif
    sine = r + r * rr * sine;
    cosine = ROLN_C(1.0) - (rr / 2 - rr * rr * cosine);
    *s = n & 1 ? cosine : sine;
    *c = n & 1 ? sine : cosine;
    if (n & 2) *s = -*s;
    if ((n + 1) & 2) *c = -*c;
}

/* The angle x without its turns, in (-pi, pi]; an x that lies there stays as it is. NaN for |x| > 2^20. */
ROLN_FN roln_real roln_wrap(roln_real x)
{
    roln_real y;
    int32_t n;
    if (!rolni_is_angle(x)) return rolni_real(ROLNI_INF | (ROLNI_INF >> 1));
    if (x > -ROLNI_PI && x <= ROLNI_PI) return x;
    n = 4 * rolni_nearest(x * ROLN_C(0.15915494309189535));
    y = rolni_less_quarters(x, n);
    if (y > ROLNI_PI) y = rolni_less_quarters(x, n + 4); /* x / 2 pi was rounded to the other side of a half */
    else if (!(y > -ROLNI_PI)) y = rolni_less_quarters(x, n - 4);
    return y > -ROLNI_PI && y <= ROLNI_PI ? y : ROLNI_PI;
}

/* ---- 5 dense kernels -------------------------------------------------------------------------- */

/* Two sum orders, fixed here, so that strict IEEE arithmetic vectorises and gives the same bits everywhere:
   order 1   one accumulator per output, contracted index ascending    roln_mm, roln_mm_at
   order 2   eight partial sums, index p into sum p mod 8, added as     roln_mm_bt, roln_dot
             ((0+4)+(2+6))+((1+5)+(3+7))
   No output depends on how many rows are computed together: a block of samples gives the same bits as its
   samples one by one. Where the target has vectors that keep denormal numbers (not the NEON of 32-bit Arm, MVE, AltiVec without
   VSX) the loops use eight reals at a time, elsewhere plain C; for MVE see ROLNI_MVE. */
#ifndef ROLN_SIMD
#if ROLNI_GNU && (defined(__SSE2__) || (defined(__ARM_NEON) && defined(__aarch64__)) || defined(__VSX__))
#define ROLN_SIMD 1
#else
#define ROLN_SIMD 0
#endif
#endif

#if ROLN_SIMD
/* rolni_w: as wide as a register; rolni_v: of at most 32 bytes, for what rolni_w leaves; both for sums whose lanes are outputs,
   where the width does not matter. rolni_v8: the lanes of order 2. */
#if defined(__AVX512F__)
#define ROLNI_WIDE 64
#define ROLNI_BYTES 32
#elif defined(__AVX__)
#define ROLNI_WIDE 32
#define ROLNI_BYTES 32
#else
#define ROLNI_WIDE 16
#define ROLNI_BYTES 16
#endif
/* Where rolni_v8 is one register, operands with several uses are read as volatile: gcc 12 else reads them for each use. */
#if defined(__AVX512F__) || (defined(__AVX__) && !defined(ROLN_DOUBLE))
#define ROLNI_ONCE volatile
#else
#define ROLNI_ONCE
#endif
#define ROLNI_W (ROLNI_AS(int, ROLNI_BYTES / sizeof(roln_real)))
#define ROLNI_LANES (ROLNI_AS(int, ROLNI_WIDE / sizeof(roln_real)))
typedef roln_real rolni_w __attribute__((__vector_size__(ROLNI_WIDE), __aligned__(sizeof(roln_real)), __may_alias__));
typedef roln_real rolni_v __attribute__((__vector_size__(ROLNI_BYTES), __aligned__(sizeof(roln_real)), __may_alias__));
typedef roln_real rolni_v8 __attribute__((__vector_size__(8 * sizeof(roln_real)), __aligned__(sizeof(roln_real)), __may_alias__));
#define ROLNI_LDT(type, p) (*ROLNI_AS(const type *, ROLNI_AS(const void *, p)))
#define ROLNI_STT(type, p, v) (*ROLNI_AS(type *, ROLNI_AS(void *, p)) = (v))
#define ROLNI_LD(p) ROLNI_LDT(rolni_v, p)
#define ROLNI_ST(p, v) ROLNI_STT(rolni_v, p, v)
#define ROLNI_LDW(p) ROLNI_LDT(rolni_w, p)
#define ROLNI_STW(p, v) ROLNI_STT(rolni_w, p, v)
#define ROLNI_LD8(p) ROLNI_LDT(rolni_v8, p)
#define ROLNI_LD8_ONCE(p) (*ROLNI_AS(const ROLNI_ONCE rolni_v8 *, ROLNI_AS(const void *, p)))
#else
/* X of each lane of a block: scalars that stay in registers, as an array does not. */
#define ROLNI_8(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7)
#define ROLNI_16(X) ROLNI_8(X) X(8) X(9) X(10) X(11) X(12) X(13) X(14) X(15)
/* Two neighbouring numbers u.x[0], u.x[1]: on Cortex-M one load, vldr.64, which needs the alignment of one of
   them; a type that says so, aligned(4), makes gcc 12 take two loads and a tick an eighth longer. */
#if defined(__arm__) && ROLNI_GNU && !defined(ROLN_DOUBLE)
typedef double __attribute__((__may_alias__)) rolni_both;
typedef union {
    rolni_both both;
    roln_real x[2];
} rolni_two;
#define ROLNI_LD2(u, p) ((u).both = *ROLNI_AS(const rolni_both *, ROLNI_AS(const void *, p)))
#else
typedef struct {
    roln_real x[2];
} rolni_two;
#define ROLNI_LD2(u, p) ((u).x[0] = (p)[0], (u).x[1] = (p)[1])
#endif
/* No load moves across, so that gcc does not fetch more numbers ahead than there are registers. No instruction; may be
   defined as nothing for a compiler that claims to be GNU C and is not. */
#ifndef ROLN_FENCE
#if ROLNI_GNU && defined(__ATOMIC_ACQ_REL)
#define ROLN_FENCE __atomic_signal_fence(__ATOMIC_ACQ_REL)
#else
#define ROLN_FENCE ((void)0)
#endif
#endif
#endif

/* One, two and four rows of a product with B, c[j] = (add ? c[j] : 0) + sum_p a[p sp] B[p][j], in blocks of columns that fit the
   registers: rolni_mm_wide from column j on as far as its blocks reach, and returns the first column that is left; rolni_mm1 to
   the end. Rows of A are si apart, rows of C follow each other. */
#if ROLN_SIMD
/* One row, four vectors beside each other. */
#define ROLNI_MM_1X4(type, w) \
    for (; j < n - n % (4 * (w)); j += 4 * (w)) { \
        const roln_real *a = a0, *b = B + j; \
        roln_real *const d = c + j; \
        type c0 = {0}, c1 = {0}, c2 = {0}, c3 = {0}; \
        if (add) { \
            c0 = ROLNI_LDT(type, d), c1 = ROLNI_LDT(type, d + (w)); \
            c2 = ROLNI_LDT(type, d + 2 * (w)), c3 = ROLNI_LDT(type, d + 3 * (w)); \
        } \
        for (p = 0; p < k; p++, a += sp, b += ldb) { \
            c0 += a[0] * ROLNI_LDT(type, b); \
            c1 += a[0] * ROLNI_LDT(type, b + (w)); \
            c2 += a[0] * ROLNI_LDT(type, b + 2 * (w)); \
            c3 += a[0] * ROLNI_LDT(type, b + 3 * (w)); \
        } \
        ROLNI_STT(type, d, c0), ROLNI_STT(type, d + (w), c1); \
        ROLNI_STT(type, d + 2 * (w), c2), ROLNI_STT(type, d + 3 * (w), c3); \
    }
ROLNI_INLINE int rolni_mm_wide(int k, int n, int j, const roln_real *a0, size_t sp, const roln_real *B, int add, roln_real *c)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int p;
#if ROLNI_WIDE > ROLNI_BYTES
    ROLNI_MM_1X4(rolni_w, ROLNI_LANES)
#endif
    ROLNI_MM_1X4(rolni_v, ROLNI_W)
    for (; j < n - n % ROLNI_W; j += ROLNI_W) {
        const roln_real *a = a0, *b = B + j;
        rolni_v c0 = {0};
        if (add) c0 = ROLNI_LD(c + j);
        for (p = 0; p < k; p++, a += sp, b += ldb)
            c0 += a[0] * ROLNI_LD(b);
        ROLNI_ST(c + j, c0);
    }
    return j;
}
#elif !ROLNI_MVE
ROLNI_INLINE int rolni_mm_wide(int k, int n, int j, const roln_real *a0, size_t sp, const roln_real *B, int add, roln_real *c)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int p;
    for (; j < n - n % 16; j += 16) {
        const roln_real *a = a0, *b = B + j;
        roln_real *const d = c + j;
#define ROLNI_X(i) roln_real c##i = add ? d[i] : 0;
        ROLNI_16(ROLNI_X)
#undef ROLNI_X
        for (p = k; p > 0; p--, a += sp, b += ldb) {
            const roln_real x = a[0];
            rolni_two u;
#define ROLNI_X(i, j) ROLNI_LD2(u, b + i), c##i += x * u.x[0], c##j += x * u.x[1];
            ROLNI_X(0, 1) ROLNI_X(2, 3) ROLNI_X(4, 5) ROLNI_X(6, 7) ROLN_FENCE;
            ROLNI_X(8, 9) ROLNI_X(10, 11) ROLNI_X(12, 13) ROLNI_X(14, 15)
#undef ROLNI_X
        }
#define ROLNI_X(i) d[i] = c##i;
        ROLNI_16(ROLNI_X)
#undef ROLNI_X
    }
    return j;
}
#endif

ROLN_FN void rolni_mm1(int k, int n, int j, const roln_real *a0, size_t sp, const roln_real *B, int add, roln_real *c)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int p;
#if !ROLNI_MVE
    j = rolni_mm_wide(k, n, j, a0, sp, B, add, c);
#endif
    for (; j < n - n % 4; j += 4) {
        const roln_real *a = a0, *b = B + j;
        roln_real c0 = 0, c1 = 0, c2 = 0, c3 = 0;
        if (add) c0 = c[j], c1 = c[j + 1], c2 = c[j + 2], c3 = c[j + 3];
        for (p = 0; p < k; p++, a += sp, b += ldb) {
            c0 += a[0] * b[0];
            c1 += a[0] * b[1];
            c2 += a[0] * b[2];
            c3 += a[0] * b[3];
        }
        c[j] = c0, c[j + 1] = c1, c[j + 2] = c2, c[j + 3] = c3;
    }
    for (; j < n; j++) {
        const roln_real *a = a0, *b = B + j;
        roln_real c0 = add ? c[j] : 0;
        for (p = 0; p < k; p++, a += sp, b += ldb)
            c0 += a[0] * b[0];
        c[j] = c0;
    }
}

#if ROLN_SIMD
/* m rows, a multiple of four: four rows of two vectors share each load of B. */
#define ROLNI_MM_4X2(type, w) \
    for (; j < n - n % (2 * (w)); j += 2 * (w)) { \
        for (i = 0; i < m; i += 4) { \
            const roln_real *a = A + ROLNI_AS(size_t, i) * si, *b = B + j; \
            roln_real *const c = C + ROLNI_AS(size_t, i) * ldb + j, *const d = c + ldb, *const e = d + ldb, *const f = e + ldb; \
            type c0 = {0}, c1 = {0}, d0 = {0}, d1 = {0}, e0 = {0}, e1 = {0}, f0 = {0}, f1 = {0}; \
            if (add) { \
                c0 = ROLNI_LDT(type, c), c1 = ROLNI_LDT(type, c + (w)), d0 = ROLNI_LDT(type, d), d1 = ROLNI_LDT(type, d + (w)); \
                e0 = ROLNI_LDT(type, e), e1 = ROLNI_LDT(type, e + (w)), f0 = ROLNI_LDT(type, f), f1 = ROLNI_LDT(type, f + (w)); \
            } \
            for (p = 0; p < k; p++, a += sp, b += ldb) { \
                const type b0 = ROLNI_LDT(type, b), b1 = ROLNI_LDT(type, b + (w)); \
                c0 += a[0] * b0, c1 += a[0] * b1; \
                d0 += a[si] * b0, d1 += a[si] * b1; \
                e0 += a[2 * si] * b0, e1 += a[2 * si] * b1; \
                f0 += a[3 * si] * b0, f1 += a[3 * si] * b1; \
            } \
            ROLNI_STT(type, c, c0), ROLNI_STT(type, c + (w), c1), ROLNI_STT(type, d, d0), ROLNI_STT(type, d + (w), d1); \
            ROLNI_STT(type, e, e0), ROLNI_STT(type, e + (w), e1), ROLNI_STT(type, f, f0), ROLNI_STT(type, f + (w), f1); \
        } \
    }
ROLNI_INLINE void rolni_mm4(int m, int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add,
                            roln_real *C)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int i, j = 0, p;
#if ROLNI_WIDE > ROLNI_BYTES
    ROLNI_MM_4X2(rolni_w, ROLNI_LANES)
#endif
    ROLNI_MM_4X2(rolni_v, ROLNI_W)
    for (i = 0; i < m; i++)
        rolni_mm1(k, n, j, A + ROLNI_AS(size_t, i) * si, sp, B, add, C + ROLNI_AS(size_t, i) * ldb);
}

/* Two rows, position and velocity of one sample: one pass over B. */
#define ROLNI_MM_2X4(type, w) \
    for (; j < n - n % (4 * (w)); j += 4 * (w)) { \
        const roln_real *a = A, *b = B + j; \
        roln_real *const c = C + j, *const d = c + ldb; \
        type c0 = {0}, c1 = {0}, c2 = {0}, c3 = {0}, d0 = {0}, d1 = {0}, d2 = {0}, d3 = {0}; \
        if (add) { \
            c0 = ROLNI_LDT(type, c), c1 = ROLNI_LDT(type, c + (w)); \
            c2 = ROLNI_LDT(type, c + 2 * (w)), c3 = ROLNI_LDT(type, c + 3 * (w)); \
            d0 = ROLNI_LDT(type, d), d1 = ROLNI_LDT(type, d + (w)); \
            d2 = ROLNI_LDT(type, d + 2 * (w)), d3 = ROLNI_LDT(type, d + 3 * (w)); \
        } \
        for (p = 0; p < k; p++, a += sp, b += ldb) { \
            const type b0 = ROLNI_LDT(type, b), b1 = ROLNI_LDT(type, b + (w)); \
            const type b2 = ROLNI_LDT(type, b + 2 * (w)), b3 = ROLNI_LDT(type, b + 3 * (w)); \
            c0 += a[0] * b0, c1 += a[0] * b1, c2 += a[0] * b2, c3 += a[0] * b3; \
            d0 += a[si] * b0, d1 += a[si] * b1, d2 += a[si] * b2, d3 += a[si] * b3; \
        } \
        ROLNI_STT(type, c, c0), ROLNI_STT(type, c + (w), c1), ROLNI_STT(type, c + 2 * (w), c2), ROLNI_STT(type, c + 3 * (w), c3); \
        ROLNI_STT(type, d, d0), ROLNI_STT(type, d + (w), d1), ROLNI_STT(type, d + 2 * (w), d2), ROLNI_STT(type, d + 3 * (w), d3); \
    }
ROLNI_INLINE void rolni_mm2(int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add, roln_real *C)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int j = 0, p;
#if ROLNI_WIDE > ROLNI_BYTES
    ROLNI_MM_2X4(rolni_w, ROLNI_LANES)
#endif
    ROLNI_MM_2X4(rolni_v, ROLNI_W)
    rolni_mm1(k, n, j, A, sp, B, add, C);
    rolni_mm1(k, n, j, A + si, sp, B, add, C + ldb);
}
#elif !ROLNI_MVE
/* Four rows by four columns, for a small B. */
ROLNI_INLINE void rolni_mm4(int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add, roln_real *C)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int j, p;
    roln_real *c = C, *d = c + ldb, *e = d + ldb, *f = e + ldb;
    for (j = 0; j < n - n % 4; j += 4, c += 4, d += 4, e += 4, f += 4) {
        const roln_real *a = A, *b = B + j;
        rolni_two u;
#define ROLNI_X(i) \
        roln_real c##i = add ? c[i] : 0, d##i = add ? d[i] : 0, e##i = add ? e[i] : 0, f##i = add ? f[i] : 0;
        ROLNI_X(0) ROLNI_X(1) ROLNI_X(2) ROLNI_X(3)
#undef ROLNI_X
        for (p = k; p > 0; p--, a += sp, b += ldb) {
            const roln_real x = a[0], y = a[si], z = a[2 * si], w = a[3 * si];
#define ROLNI_X(i, j) \
            ROLNI_LD2(u, b + i), c##i += x * u.x[0], c##j += x * u.x[1], d##i += y * u.x[0], d##j += y * u.x[1], \
            e##i += z * u.x[0], e##j += z * u.x[1], f##i += w * u.x[0], f##j += w * u.x[1];
            ROLNI_X(0, 1) ROLNI_X(2, 3)
#undef ROLNI_X
        }
#define ROLNI_X(i) c[i] = c##i, d[i] = d##i, e[i] = e##i, f[i] = f##i;
        ROLNI_X(0) ROLNI_X(1) ROLNI_X(2) ROLNI_X(3)
#undef ROLNI_X
    }
    for (p = 0; p < 4 && j < n; p++)
        rolni_mm1(k, n, j, A + ROLNI_AS(size_t, p) * si, sp, B, add, C + ROLNI_AS(size_t, p) * ldb);
}

/* Two rows, position and velocity of one sample, by eight columns. */
ROLNI_INLINE void rolni_mm2(int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add, roln_real *C)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int j, p;
    roln_real *c = C, *d = c + ldb;
    for (j = 0; j < n - n % 8; j += 8, c += 8, d += 8) {
        const roln_real *a = A, *b = B + j;
        rolni_two u;
#define ROLNI_X(i) roln_real c##i = add ? c[i] : 0, d##i = add ? d[i] : 0;
        ROLNI_8(ROLNI_X)
#undef ROLNI_X
        for (p = k; p > 0; p--, a += sp, b += ldb) {
            const roln_real x = a[0], y = a[si];
#define ROLNI_X(i, j) ROLNI_LD2(u, b + i), c##i += x * u.x[0], c##j += x * u.x[1], d##i += y * u.x[0], d##j += y * u.x[1];
            ROLNI_X(0, 1) ROLNI_X(2, 3) ROLN_FENCE; ROLNI_X(4, 5) ROLNI_X(6, 7)
#undef ROLNI_X
        }
#define ROLNI_X(i) c[i] = c##i, d[i] = d##i;
        ROLNI_8(ROLNI_X)
#undef ROLNI_X
    }
    for (p = 0; p < 2 && j < n; p++)
        rolni_mm1(k, n, j, A + ROLNI_AS(size_t, p) * si, sp, B, add, C + ROLNI_AS(size_t, p) * ldb);
}
#else
/* Helium: columns from j on, in blocks, until a number on the way is denormal; returns the first column that is left. One row,
   whose numbers of A follow each other: */
ROLNI_INLINE int rolni_mve_mm1(int k, int n, int j, const roln_real *A, const roln_real *B, int add, roln_real *C)
{
    int p;
    B = rolni_mve_begin(B);
    for (; j <= n - 24 && j != n - 32; j += 24) { /* 32 are two blocks of 16 */
        const roln_real *a = A, *b = B + j;
        roln_real *const c = C + j;
        float32x4_t c0 = vdupq_n_f32(0), c1 = c0, c2 = c0, c3 = c0, c4 = c0, c5 = c0;
        if (add) c0 = rolni_mve_load(c), c1 = rolni_mve_load(c + 4), c2 = rolni_mve_load(c + 8), c3 = rolni_mve_load(c + 12);
        if (add) c4 = rolni_mve_load(c + 16), c5 = rolni_mve_load(c + 20);
        for (p = k; p > 0; p--, b += n - 24) {
            const roln_real x = *a++;
            c0 = vaddq_f32(c0, vmulq_n_f32(rolni_mve_next4(&b), x)), c1 = vaddq_f32(c1, vmulq_n_f32(rolni_mve_next4(&b), x));
            c2 = vaddq_f32(c2, vmulq_n_f32(rolni_mve_next4(&b), x)), c3 = vaddq_f32(c3, vmulq_n_f32(rolni_mve_next4(&b), x));
            c4 = vaddq_f32(c4, vmulq_n_f32(rolni_mve_next4(&b), x)), c5 = vaddq_f32(c5, vmulq_n_f32(rolni_mve_next4(&b), x));
        }
        rolni_mve_end(&c0), rolni_mve_end(&c1), rolni_mve_end(&c2), rolni_mve_end(&c3), rolni_mve_end(&c4), rolni_mve_end(&c5);
        if (rolni_mve_denormal()) return j;
        rolni_mve_store(c, c0), rolni_mve_store(c + 4, c1), rolni_mve_store(c + 8, c2), rolni_mve_store(c + 12, c3);
        rolni_mve_store(c + 16, c4), rolni_mve_store(c + 20, c5);
    }
    for (; j <= n - 16; j += 16) {
        const roln_real *a = A, *b = B + j;
        roln_real *const c = C + j;
        float32x4_t c0 = vdupq_n_f32(0), c1 = c0, c2 = c0, c3 = c0;
        if (add) c0 = rolni_mve_load(c), c1 = rolni_mve_load(c + 4), c2 = rolni_mve_load(c + 8), c3 = rolni_mve_load(c + 12);
        for (p = k; p > 0; p--, b += n - 16) {
            const roln_real x = *a++;
            c0 = vaddq_f32(c0, vmulq_n_f32(rolni_mve_next4(&b), x)), c1 = vaddq_f32(c1, vmulq_n_f32(rolni_mve_next4(&b), x));
            c2 = vaddq_f32(c2, vmulq_n_f32(rolni_mve_next4(&b), x)), c3 = vaddq_f32(c3, vmulq_n_f32(rolni_mve_next4(&b), x));
        }
        rolni_mve_end(&c0), rolni_mve_end(&c1), rolni_mve_end(&c2), rolni_mve_end(&c3);
        if (rolni_mve_denormal()) return j;
        rolni_mve_store(c, c0), rolni_mve_store(c + 4, c1), rolni_mve_store(c + 8, c2), rolni_mve_store(c + 12, c3);
    }
    for (; j <= n - 4; j += 4) {
        const roln_real *a = A, *b = B + j;
        float32x4_t c0 = vdupq_n_f32(0);
        if (add) c0 = rolni_mve_load(C + j);
        for (p = k; p > 0; p--, b += n)
            c0 = vaddq_f32(c0, vmulq_n_f32(rolni_mve_load(b), *a++));
        rolni_mve_end(&c0);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(C + j, c0);
    }
    return j;
}

/* Two of them, and three. */
ROLNI_MVE_FN int rolni_mve_mm2(int k, int n, const roln_real *A, size_t si, const roln_real *B, int add, roln_real *C)
{
    int j, p;
    B = rolni_mve_begin(B);
    for (j = 0; j < n - n % 8; j += 8) {
        const roln_real *a0 = A, *a1 = a0 + si, *b = B + j;
        roln_real *const c = C + j, *const d = c + n;
        float32x4_t c0 = vdupq_n_f32(0), c1 = c0, d0 = c0, d1 = c0;
        if (add) c0 = rolni_mve_load(c), c1 = rolni_mve_load(c + 4), d0 = rolni_mve_load(d), d1 = rolni_mve_load(d + 4);
        for (p = k; p > 0; p--, b += n - 8) {
            const float32x4_t b0 = rolni_mve_next4(&b), b1 = rolni_mve_next4(&b);
            const roln_real x = *a0++, y = *a1++;
            c0 = vaddq_f32(c0, vmulq_n_f32(b0, x)), c1 = vaddq_f32(c1, vmulq_n_f32(b1, x));
            d0 = vaddq_f32(d0, vmulq_n_f32(b0, y)), d1 = vaddq_f32(d1, vmulq_n_f32(b1, y));
        }
        rolni_mve_end(&c0), rolni_mve_end(&c1), rolni_mve_end(&d0), rolni_mve_end(&d1);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(c, c0), rolni_mve_store(c + 4, c1), rolni_mve_store(d, d0), rolni_mve_store(d + 4, d1);
    }
    return j;
}

ROLNI_MVE_FN int rolni_mve_mm3(int k, int n, const roln_real *A, size_t si, const roln_real *B, int add, roln_real *C)
{
    int j, p;
    B = rolni_mve_begin(B);
    for (j = 0; j < n - n % 8; j += 8) {
        const roln_real *a0 = A, *a1 = a0 + si, *a2 = a1 + si, *b = B + j;
        roln_real *const c = C + j, *const d = c + n, *const e = d + n;
        float32x4_t c0 = vdupq_n_f32(0), c1 = c0, d0 = c0, d1 = c0, e0 = c0, e1 = c0;
        if (add) c0 = rolni_mve_load(c), c1 = rolni_mve_load(c + 4), d0 = rolni_mve_load(d), d1 = rolni_mve_load(d + 4);
        if (add) e0 = rolni_mve_load(e), e1 = rolni_mve_load(e + 4);
        for (p = k; p > 0; p--, b += n - 8) {
            const roln_real x = *a0++, y = *a1++, z = *a2++;
            float32x4_t v = rolni_mve_next4(&b);
            c0 = vaddq_f32(c0, vmulq_n_f32(v, x)), d0 = vaddq_f32(d0, vmulq_n_f32(v, y)), e0 = vaddq_f32(e0, vmulq_n_f32(v, z));
            v = rolni_mve_next4(&b);
            c1 = vaddq_f32(c1, vmulq_n_f32(v, x)), d1 = vaddq_f32(d1, vmulq_n_f32(v, y)), e1 = vaddq_f32(e1, vmulq_n_f32(v, z));
        }
        rolni_mve_end(&c0), rolni_mve_end(&c1), rolni_mve_end(&d0), rolni_mve_end(&d1), rolni_mve_end(&e0), rolni_mve_end(&e1);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(c, c0), rolni_mve_store(c + 4, c1), rolni_mve_store(d, d0), rolni_mve_store(d + 4, d1);
        rolni_mve_store(e, e0), rolni_mve_store(e + 4, e1);
    }
    return j;
}

/* Four rows of any strides, for a small B and for the transposed A of roln_mm_at. */
ROLNI_MVE_FN int rolni_mve_mm4(int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add, roln_real *C)
{
    int j, p;
    B = rolni_mve_begin(B);
    for (j = 0; j < n - n % 4; j += 4) {
        const roln_real *a0 = A, *a1 = a0 + si, *a2 = a1 + si, *a3 = a2 + si, *b = B + j;
        roln_real *const c = C + j, *const d = c + n, *const e = d + n, *const f = e + n;
        float32x4_t v0 = vdupq_n_f32(0), v1 = v0, v2 = v0, v3 = v0;
        if (add) v0 = rolni_mve_load(c), v1 = rolni_mve_load(d), v2 = rolni_mve_load(e), v3 = rolni_mve_load(f);
        for (p = k; p > 0; p--, a0 += sp, a1 += sp, a2 += sp, a3 += sp, b += n) {
            const float32x4_t v = rolni_mve_load(b);
            v0 = vaddq_f32(v0, vmulq_n_f32(v, *a0)), v1 = vaddq_f32(v1, vmulq_n_f32(v, *a1));
            v2 = vaddq_f32(v2, vmulq_n_f32(v, *a2)), v3 = vaddq_f32(v3, vmulq_n_f32(v, *a3));
        }
        rolni_mve_end(&v0), rolni_mve_end(&v1), rolni_mve_end(&v2), rolni_mve_end(&v3);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(c, v0), rolni_mve_store(d, v1), rolni_mve_store(e, v2), rolni_mve_store(f, v3);
    }
    return j;
}

/* One row from column j on: by Helium, then in plain C. */
ROLNI_MVE_FN void rolni_mve_row(int k, int n, int j, const roln_real *A, size_t sp, const roln_real *B, int add, roln_real *C)
{
    if (sp == 1 || k == 1) j = rolni_mve_mm1(k, n, j, A, B, add, C);
    if (j < n) rolni_mm1(k, n, j, A, sp, B, add, C);
}
#endif

/* C[i][j] = (add ? C[i][j] : 0) + sum_p A[i si + p sp] B[p][j], i < m, p < k, j < n, in order 1. */
ROLN_FN void rolni_mm(int m, int k, int n, const roln_real *A, size_t si, size_t sp, const roln_real *B, int add, roln_real *C)
{
    const size_t ldb = ROLNI_AS(size_t, n);
    int i = 0;
#if ROLN_SIMD
    i = m - m % 4;
    rolni_mm4(i, k, n, A, si, sp, B, add, C);
    for (; i < m - m % 2; i += 2)
        rolni_mm2(k, n, A + ROLNI_AS(size_t, i) * si, si, sp, B, add, C + ROLNI_AS(size_t, i) * ldb);
#elif ROLNI_MVE
    const int row = sp == 1 || k == 1;
    int rows, j, r;
    if (m == 1) {
        rolni_mve_row(k, n, 0, A, sp, B, add, C);
        return;
    }
    for (; i < m; i += rows, A += ROLNI_AS(size_t, rows) * si, C += ROLNI_AS(size_t, rows) * ldb) {
        const int left = m - i;
        rows = 1, j = 0;
        if (left >= 4 && (!row || n < 8)) rows = 4, j = rolni_mve_mm4(k, n, A, si, sp, B, add, C);
        else if (row && n >= 8 && left != 4 && left >= 3) rows = 3, j = rolni_mve_mm3(k, n, A, si, B, add, C);
        else if (row && n >= 8 && left >= 2) rows = 2, j = rolni_mve_mm2(k, n, A, si, B, add, C);
        for (r = 0; r < rows && j < n; r++)
            rolni_mve_row(k, n, j, A + ROLNI_AS(size_t, r) * si, sp, B, add, C + ROLNI_AS(size_t, r) * ldb);
    }
#else
    for (; i < m - m % 4 && n < 8; i += 4)
        rolni_mm4(k, n, A + ROLNI_AS(size_t, i) * si, si, sp, B, add, C + ROLNI_AS(size_t, i) * ldb);
    for (; i < m - m % 2 && n >= 8; i += 2)
        rolni_mm2(k, n, A + ROLNI_AS(size_t, i) * si, si, sp, B, add, C + ROLNI_AS(size_t, i) * ldb);
#endif
#if !ROLNI_MVE
    for (; i < m; i++)
        rolni_mm1(k, n, 0, A + ROLNI_AS(size_t, i) * si, sp, B, add, C + ROLNI_AS(size_t, i) * ldb);
#endif
}

/* C = A B, A [m][k], B [k][n], C [m][n]. With m = 1 the mat-vec c = B^T a. C may not overlap A or B. */
ROLN_FN void roln_mm(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    rolni_mm(m, k, n, A, ROLNI_AS(size_t, k), 1, B, 0, C);
}

/* C += A^T B, A [k][m], B [k][n], C [m][n]: the gradient of a weight, summed over the k samples of a block.
   With k = 1 the rank-one update C += a b^T. C may not overlap A or B. */
ROLN_FN void roln_mm_at(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    rolni_mm(m, k, n, A, 1, ROLNI_AS(size_t, m), B, 1, C);
}

/* sum_p a[p] b[p], p < n, in order 2. */
ROLN_FN roln_real roln_dot(int n, const roln_real *a, const roln_real *b)
{
    roln_real s0 = 0, s1 = 0, s2 = 0, s3 = 0, s4 = 0, s5 = 0, s6 = 0, s7 = 0;
    int p;
#if ROLN_SIMD
    if (n >= 8) {
        rolni_v8 v = {0};
        for (p = 0; p < n - n % 8; p += 8)
            v += ROLNI_LD8(a + p) * ROLNI_LD8(b + p);
        s0 = v[0], s1 = v[1], s2 = v[2], s3 = v[3], s4 = v[4], s5 = v[5], s6 = v[6], s7 = v[7];
    }
    p = n - n % 8;
#else
    for (p = 0; p < n - n % 8; p += 8) {
        s0 += a[p] * b[p];
        s1 += a[p + 1] * b[p + 1];
        s2 += a[p + 2] * b[p + 2];
        s3 += a[p + 3] * b[p + 3];
        s4 += a[p + 4] * b[p + 4];
        s5 += a[p + 5] * b[p + 5];
        s6 += a[p + 6] * b[p + 6];
        s7 += a[p + 7] * b[p + 7];
    }
#endif
    switch (n - p) {
    case 7: s6 += a[p + 6] * b[p + 6]; /* fall through */
    case 6: s5 += a[p + 5] * b[p + 5]; /* fall through */
    case 5: s4 += a[p + 4] * b[p + 4]; /* fall through */
    case 4: s3 += a[p + 3] * b[p + 3]; /* fall through */
    case 3: s2 += a[p + 2] * b[p + 2]; /* fall through */
    case 2: s1 += a[p + 1] * b[p + 1]; /* fall through */
    case 1: s0 += a[p] * b[p];         /* fall through */
    default: break;
    }
    return ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7));
}

#if !ROLN_SIMD && !ROLNI_MVE
/* c[0] = sum_p a[p] b[p], c[1] = sum_p a[p] d[p], as roln_dot. The first products stand for 0 + them, which differs where
   they are -0; with one sum that is not, the total is not, as it is not in roln_dot. */
ROLN_FN void rolni_dot2(int n, const roln_real *a, const roln_real *b, const roln_real *d, roln_real *c)
{
    rolni_two u, v, w;
    int p;
#define ROLNI_X(i) roln_real s##i = 0, t##i = 0;
    ROLNI_8(ROLNI_X)
#undef ROLNI_X
#define ROLNI_X(i, j, op) \
    ROLNI_LD2(u, a + i), ROLNI_LD2(v, b + i), ROLNI_LD2(w, d + i); \
    s##i op u.x[0] * v.x[0], s##j op u.x[1] * v.x[1], t##i op u.x[0] * w.x[0], t##j op u.x[1] * w.x[1];
    p = n >> 3;
    if (p > 0) {
        ROLNI_X(0, 1, =) ROLNI_X(2, 3, =) ROLN_FENCE; ROLNI_X(4, 5, =) ROLNI_X(6, 7, =)
        s0 += 0, t0 += 0, a += 8, b += 8, d += 8;
    }
    while (--p > 0) {
        ROLNI_X(0, 1, +=) ROLN_FENCE; ROLNI_X(2, 3, +=) ROLN_FENCE; ROLNI_X(4, 5, +=) ROLN_FENCE; ROLNI_X(6, 7, +=)
        a += 8, b += 8, d += 8;
    }
#undef ROLNI_X
#define ROLNI_X(i) s##i += a[i] * b[i], t##i += a[i] * d[i];
    switch (n & 7) {
    case 7: ROLNI_X(6) /* fall through */
    case 6: ROLNI_X(5) /* fall through */
    case 5: ROLNI_X(4) /* fall through */
    case 4: ROLNI_X(3) /* fall through */
    case 3: ROLNI_X(2) /* fall through */
    case 2: ROLNI_X(1) /* fall through */
    case 1: ROLNI_X(0) /* fall through */
    default: break;
    }
#undef ROLNI_X
    c[0] = ((s0 + s4) + (s2 + s6)) + ((s1 + s5) + (s3 + s7));
    c[1] = ((t0 + t4) + (t2 + t6)) + ((t1 + t5) + (t3 + t7));
}
#endif

#if ROLN_SIMD
#if defined(__clang__) || __GNUC__ >= 12
#define ROLNI_SHUFFLE __builtin_shufflevector
/* c[0..3] = the order-2 sums of four accumulators, three halvings of all four at once. */
#define ROLNI_SUM4(v0, v1, v2, v3, c) \
    do { \
        const rolni_v8 s_ = ROLNI_SHUFFLE(v0, v1, 0, 1, 2, 3, 8, 9, 10, 11) + ROLNI_SHUFFLE(v0, v1, 4, 5, 6, 7, 12, 13, 14, 15); \
        const rolni_v8 t_ = ROLNI_SHUFFLE(v2, v3, 0, 1, 2, 3, 8, 9, 10, 11) + ROLNI_SHUFFLE(v2, v3, 4, 5, 6, 7, 12, 13, 14, 15); \
        const rolni_v8 u_ = ROLNI_SHUFFLE(s_, t_, 0, 1, 8, 9, 4, 5, 12, 13) + ROLNI_SHUFFLE(s_, t_, 2, 3, 10, 11, 6, 7, 14, 15); \
        (c)[0] = u_[0] + u_[1], (c)[2] = u_[2] + u_[3], (c)[1] = u_[4] + u_[5], (c)[3] = u_[6] + u_[7]; \
    } while (0)
#else
#define ROLNI_SUM1(v) (((v[0] + v[4]) + (v[2] + v[6])) + ((v[1] + v[5]) + (v[3] + v[7])))
#define ROLNI_SUM4(v0, v1, v2, v3, c) \
    ((c)[0] = ROLNI_SUM1(v0), (c)[1] = ROLNI_SUM1(v1), (c)[2] = ROLNI_SUM1(v2), (c)[3] = ROLNI_SUM1(v3))
#endif
#endif

#if ROLNI_MVE
/* roln_mm_bt for k = 4, n >= 4: four columns at a time. The last four may be among those before, whose sums are the same again.
   First products stand for 0 + them, as in rolni_dot2. Columns with a denormal number on the way are computed again. */
ROLNI_MVE_FN void rolni_mve_mm_bt4(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    int i, j;
    B = rolni_mve_begin(B);
    for (; m > 0; m--, A += 4, C += n)
        for (j = 0; j < n; j += 4) {
            const int first = ROLN_MIN(j, n - 4);
            const float32x4x4_t b = vld4q_f32(B + 4 * first);
            const float32x4_t even = vaddq_f32(vaddq_n_f32(vmulq_n_f32(b.val[0], A[0]), 0), vmulq_n_f32(b.val[2], A[2]));
            float32x4_t v = vaddq_f32(even, vaddq_f32(vmulq_n_f32(b.val[1], A[1]), vmulq_n_f32(b.val[3], A[3])));
            rolni_mve_end(&v);
            rolni_mve_store(C + first, v);
            if (!rolni_mve_denormal()) continue;
            for (i = first; i < first + 4; i++)
                C[i] = roln_dot(k, A, B + 4 * i);
            B = rolni_mve_begin(B);
        }
}

/* Four lanes of order 2 of four columns, k >= 4: lane l of v[i] is the sum of a[p] B[i][p] over p = l, l + 8, l + 16 .. < k. */
ROLNI_INLINE void rolni_mve_lanes(int k, const roln_real *a, const roln_real *b0, int ld, float32x4x4_t *v)
{
    const roln_real *b1 = b0 + ld, *b2 = b1 + ld, *b3 = b2 + ld;
    float32x4_t x = rolni_mve_next8(&a), v0 = vmulq_f32(rolni_mve_next8(&b0), x), v1 = vmulq_f32(rolni_mve_next8(&b1), x);
    float32x4_t v2 = vmulq_f32(rolni_mve_next8(&b2), x), v3 = vmulq_f32(rolni_mve_next8(&b3), x);
    int p;
    for (p = (k - 4) >> 3; p > 0; p--) {
        x = rolni_mve_next8(&a);
        v0 = vaddq_f32(v0, vmulq_f32(rolni_mve_next8(&b0), x)), v1 = vaddq_f32(v1, vmulq_f32(rolni_mve_next8(&b1), x));
        v2 = vaddq_f32(v2, vmulq_f32(rolni_mve_next8(&b2), x)), v3 = vaddq_f32(v3, vmulq_f32(rolni_mve_next8(&b3), x));
    }
    v->val[0] = v0, v->val[1] = v1, v->val[2] = v2, v->val[3] = v3;
}

/* The same for k = 8, 12, 16 .. */
ROLNI_MVE_FN void rolni_mve_mm_bt(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    roln_real room[16], *t = room;
    int i, j;
    A = rolni_mve_begin(A);
    __asm__("" : "+r"(t)); /* vectors are not stored beside sp: one register has the address of all */
    for (; m > 0; m--, A += k, C += n)
        for (j = 0; j < n; j += 4) {
            const int first = ROLN_MIN(j, n - 4);
            const roln_real *const b = B + first * k;
            float32x4x4_t v;
            float32x4_t sum;
            rolni_mve_lanes(k, A, b, k, &v);
            rolni_mve_store(t, v.val[0]), rolni_mve_store(t + 4, v.val[1]);
            rolni_mve_store(t + 8, v.val[2]), rolni_mve_store(t + 12, v.val[3]);
            rolni_mve_lanes(k - 4, A + 4, b + 4, k, &v);
            rolni_mve_store(t, vaddq_f32(v.val[0], rolni_mve_load(t)));
            rolni_mve_store(t + 4, vaddq_f32(v.val[1], rolni_mve_load(t + 4)));
            rolni_mve_store(t + 8, vaddq_f32(v.val[2], rolni_mve_load(t + 8)));
            rolni_mve_store(t + 12, vaddq_f32(v.val[3], rolni_mve_load(t + 12)));
            v = vld4q_f32(t);
            sum = vaddq_f32(vaddq_f32(vaddq_n_f32(v.val[0], 0), v.val[2]), vaddq_f32(v.val[1], v.val[3]));
            rolni_mve_end(&sum);
            rolni_mve_store(C + first, sum);
            if (!rolni_mve_denormal()) continue;
            for (i = first; i < first + 4; i++)
                C[i] = roln_dot(k, A, B + i * k);
            A = rolni_mve_begin(A);
        }
}
#endif

/* C = A B^T, A [m][k], B [n][k], C [m][n], in order 2. With m = 1 the mat-vec c = B a. C may not overlap A or B. */
ROLN_FN void roln_mm_bt(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C)
{
    const size_t ld = ROLNI_AS(size_t, k), ldc = ROLNI_AS(size_t, n);
    int i, j = 0;
#if ROLNI_MVE
    if (k == 4 && n >= 4) {
        rolni_mve_mm_bt4(m, k, n, A, B, C);
        return;
    }
    if (k > 4 && n >= 4 && k % 4 == 0) {
        rolni_mve_mm_bt(m, k, n, A, B, C);
        return;
    }
#endif
#if ROLN_SIMD
    if (k % 8 == 0) {
        for (; j < n - n % 4; j += 4) { /* four rows of B, two of A: eight accumulators */
            const roln_real *b = B + ROLNI_AS(size_t, j) * ld;
            int p;
            for (i = 0; i < m - m % 2; i += 2) {
                const roln_real *a = A + ROLNI_AS(size_t, i) * ld;
                roln_real *c = C + ROLNI_AS(size_t, i) * ldc + j;
                rolni_v8 v00 = {0}, v01 = {0}, v02 = {0}, v03 = {0}, v10 = {0}, v11 = {0}, v12 = {0}, v13 = {0};
                for (p = 0; p < k; p += 8) {
                    const rolni_v8 a0 = ROLNI_LD8_ONCE(a + p), a1 = ROLNI_LD8_ONCE(a + ld + p);
                    const rolni_v8 b0 = ROLNI_LD8_ONCE(b + p), b1 = ROLNI_LD8_ONCE(b + ld + p);
                    const rolni_v8 b2 = ROLNI_LD8_ONCE(b + 2 * ld + p), b3 = ROLNI_LD8_ONCE(b + 3 * ld + p);
                    v00 += a0 * b0, v01 += a0 * b1, v02 += a0 * b2, v03 += a0 * b3;
                    v10 += a1 * b0, v11 += a1 * b1, v12 += a1 * b2, v13 += a1 * b3;
                }
                ROLNI_SUM4(v00, v01, v02, v03, c);
                ROLNI_SUM4(v10, v11, v12, v13, c + ldc);
            }
            if (m % 2) {
                const roln_real *a = A + ROLNI_AS(size_t, i) * ld;
                roln_real *c = C + ROLNI_AS(size_t, i) * ldc + j;
                rolni_v8 v0 = {0}, v1 = {0}, v2 = {0}, v3 = {0};
                for (p = 0; p < k; p += 8) {
                    const rolni_v8 a0 = ROLNI_LD8(a + p);
                    v0 += a0 * ROLNI_LD8(b + p), v1 += a0 * ROLNI_LD8(b + ld + p);
                    v2 += a0 * ROLNI_LD8(b + 2 * ld + p), v3 += a0 * ROLNI_LD8(b + 3 * ld + p);
                }
                ROLNI_SUM4(v0, v1, v2, v3, c);
            }
        }
    }
#endif
    for (i = 0; i < m; i++) {
        const roln_real *a = A + ROLNI_AS(size_t, i) * ld;
        roln_real *c = C + ROLNI_AS(size_t, i) * ldc;
        int jj = j;
#if !ROLN_SIMD && !ROLNI_MVE
        for (; jj < n - n % 2; jj += 2)
            rolni_dot2(k, a, B + ROLNI_AS(size_t, jj) * ld, B + ROLNI_AS(size_t, jj + 1) * ld, c + jj);
#endif
        for (; jj < n; jj++)
            c[jj] = roln_dot(k, a, B + ROLNI_AS(size_t, jj) * ld);
    }
}

/* Where code may be larger, sizes up to 6 are constants to the compiler: a third to a half of the time, the same bits. */
#if ROLN_SIMD
#define ROLNI_SMALL(n, ROLNI_CASE) \
    switch (n) { \
    case 1: ROLNI_CASE(1); \
    case 2: ROLNI_CASE(2); \
    case 3: ROLNI_CASE(3); \
    case 4: ROLNI_CASE(4); \
    case 5: ROLNI_CASE(5); \
    case 6: ROLNI_CASE(6); \
    default: break; \
    }
#else
#define ROLNI_SMALL(n, ROLNI_CASE)
#endif

/* roln_dot of at most 5 numbers, n a constant: without branches. */
ROLNI_INLINE roln_real rolni_dot5(int n, const roln_real *a, const roln_real *b)
{
    const roln_real s0 = n > 0 ? 0 + a[0] * b[0] : 0, s1 = n > 1 ? 0 + a[1] * b[1] : 0, s2 = n > 2 ? 0 + a[2] * b[2] : 0;
    const roln_real s3 = n > 3 ? 0 + a[3] * b[3] : 0, s4 = n > 4 ? 0 + a[4] * b[4] : 0;
    return ((s0 + s4) + s2) + (s1 + s3);
}

/* Column j of roln_chol; 1 if its pivot is not positive or not finite. constant: n, at most 6, and j are constants. */
ROLNI_INLINE int rolni_chol_column(int constant, int n, int j, const roln_real *A, roln_real *L)
{
    const roln_real *const l = L + j * n;
    roln_real s = A[j * n + j] - (constant ? rolni_dot5(j, l, l) : roln_dot(j, l, l));
    int i;
    if (!(s > 0) || !roln_finite(s)) return 1;
    s = L[j * n + j] = ROLN_SQRT(s);
    for (i = j + 1; i < n; i++) {
        L[i * n + j] = (A[i * n + j] - (constant ? rolni_dot5(j, L + i * n, l) : roln_dot(j, L + i * n, l))) / s;
        L[j * n + i] = 0;
    }
    return 0;
}

ROLNI_INLINE roln_status rolni_chol_small(int n, const roln_real *A, roln_real *L)
{
    if (rolni_chol_column(1, n, 0, A, L) || (n > 1 && rolni_chol_column(1, n, 1, A, L)) ||
        (n > 2 && rolni_chol_column(1, n, 2, A, L)) || (n > 3 && rolni_chol_column(1, n, 3, A, L)) ||
        (n > 4 && rolni_chol_column(1, n, 4, A, L)) || (n > 5 && rolni_chol_column(1, n, 5, A, L)))
        return ROLN_E_NOT_SPD;
    return ROLN_OK;
}

/* Lower Cholesky factor, A = L L^T: A [n][n] symmetric (lower triangle read), L [n][n], zero above the diagonal.
   L may be A. ROLN_E_NOT_SPD if a pivot is not positive or not finite; then L holds no result. n^3/6 multiply-adds.
   |L L^T - A|_ij <= (n + 2) eps/2 sqrt(A_ii A_jj); and no A is refused that, scaled to a diagonal of 1, has no eigenvalue below
   n (n + 2) eps/2 (Demmel 1989; spd_million.c: check_solve). */
ROLN_FN roln_status roln_chol(int n, const roln_real *A, roln_real *L)
{
    int j;
#define ROLNI_X(k) return rolni_chol_small(k, A, L)
    ROLNI_SMALL(n, ROLNI_X)
#undef ROLNI_X
    for (j = 0; j < n; j++) /* by columns: the rows of one do not wait for each other */
        if (rolni_chol_column(0, n, j, A, L)) return ROLN_E_NOT_SPD;
    return ROLN_OK;
}

ROLNI_INLINE void rolni_solve_lower_small(int n, const roln_real *L, const roln_real *b, roln_real *x)
{
    x[0] = b[0] / L[0];
    if (n > 1) x[1] = (b[1] - rolni_dot5(1, L + n, x)) / L[n + 1];
    if (n > 2) x[2] = (b[2] - rolni_dot5(2, L + 2 * n, x)) / L[2 * n + 2];
    if (n > 3) x[3] = (b[3] - rolni_dot5(3, L + 3 * n, x)) / L[3 * n + 3];
    if (n > 4) x[4] = (b[4] - rolni_dot5(4, L + 4 * n, x)) / L[4 * n + 4];
    if (n > 5) x[5] = (b[5] - rolni_dot5(5, L + 5 * n, x)) / L[5 * n + 5];
}

/* Solve L x = b (lower triangular L [n][n]). x may be b. */
ROLN_FN void roln_solve_lower(int n, const roln_real *L, const roln_real *b, roln_real *x)
{
    int i;
#define ROLNI_X(k) rolni_solve_lower_small(k, L, b, x); return
    ROLNI_SMALL(n, ROLNI_X)
#undef ROLNI_X
    for (i = 0; i < n; i++)
        x[i] = (b[i] - roln_dot(i, L + i * n, x)) / L[i * n + i];
}

/* x_i of roln_solve_lower_t, and from the numbers before it. */
ROLNI_INLINE void rolni_solve_lower_t_row(int n, int i, const roln_real *L, roln_real *x)
{
    int j;
    x[i] /= L[i * n + i];
    for (j = 0; j < i; j++)
        x[j] -= L[i * n + j] * x[i];
}

ROLNI_INLINE void rolni_solve_lower_t_small(int n, const roln_real *L, roln_real *x)
{
    if (n > 5) rolni_solve_lower_t_row(n, 5, L, x);
    if (n > 4) rolni_solve_lower_t_row(n, 4, L, x);
    if (n > 3) rolni_solve_lower_t_row(n, 3, L, x);
    if (n > 2) rolni_solve_lower_t_row(n, 2, L, x);
    if (n > 1) rolni_solve_lower_t_row(n, 1, L, x);
    rolni_solve_lower_t_row(n, 0, L, x);
}

/* Solve L^T x = b (lower triangular L [n][n]), by columns. x may be b. After roln_chol and roln_solve_lower (A + E) x = b with
   |E_ij| <= 3 (n + 2) eps/2 sqrt(A_ii A_jj) (spd_million.c: check_solve). */
ROLN_FN void roln_solve_lower_t(int n, const roln_real *L, const roln_real *b, roln_real *x)
{
    int i;
    for (i = 0; i < n; i++)
        x[i] = b[i];
#define ROLNI_X(k) rolni_solve_lower_t_small(k, L, x); return
    ROLNI_SMALL(n, ROLNI_X)
#undef ROLNI_X
    for (i = n - 1; i >= 0; i--)
        rolni_solve_lower_t_row(n, i, L, x);
}

/* Inverse X of a general A [n][n] by Gauss-Jordan elimination with row pivoting. X may not be A. 2 n^3 multiply-adds.
   ROLN_E_ILL_CONDITIONED if |A|_1 |X|_1 > 1 / (64 n eps) or a pivot vanishes (NaN and infinity end there too);
   then X holds no result. Of symmetric A within n eps |A|_1 |X|_1 max|X| (spd_million.c: check_solve). */
#define ROLN_INV_MEM(X, n) X(W, (n) * (n))
#define ROLN_INV_WORK(n) (0 ROLN_INV_MEM(ROLNI_SIZE, n))
ROLN_FN roln_status roln_inv(int n, const roln_real *A, roln_real *X, roln_real *work)
{
    roln_real na = 0, nx = 0, t;
    int i, j, k;
    ROLN_INV_MEM(ROLNI_CARVE, n)
    for (i = 0; i < n * n; i++)
        W[i] = A[i], X[i] = 0;
    for (i = 0; i < n; i++)
        X[i * n + i] = 1;
    for (k = 0; k < n; k++) {
        int piv = k;
        for (i = k + 1; i < n; i++)
            if (ROLN_ABS(W[i * n + k]) > ROLN_ABS(W[piv * n + k])) piv = i;
        for (j = 0; j < n && piv != k; j++) {
            t = W[k * n + j], W[k * n + j] = W[piv * n + j], W[piv * n + j] = t;
            t = X[k * n + j], X[k * n + j] = X[piv * n + j], X[piv * n + j] = t;
        }
        t = 1 / W[k * n + k];
        if (!roln_finite(t)) return ROLN_E_ILL_CONDITIONED;
        for (j = 0; j < n; j++)
            W[k * n + j] *= t, X[k * n + j] *= t;
        for (i = 0; i < n; i++) {
            t = W[i * n + k];
            for (j = 0; j < n && i != k; j++)
                W[i * n + j] -= t * W[k * n + j], X[i * n + j] -= t * X[k * n + j];
        }
    }
    for (j = 0; j < n; j++) { /* condition in the 1-norm */
        roln_real ca = 0, cx = 0;
        for (i = 0; i < n; i++)
            ca += ROLN_ABS(A[i * n + j]), cx += ROLN_ABS(X[i * n + j]);
        na = ca > na ? ca : na;
        nx = cx > nx ? cx : nx;
        if (!roln_finite(ca) || !roln_finite(cx)) return ROLN_E_ILL_CONDITIONED;
    }
    return na * nx * (64 * ROLNI_AS(roln_real, n) * ROLN_EPS) < 1 ? ROLN_OK : ROLN_E_ILL_CONDITIONED;
}

/* Step k of roln_qr_r: swaps rows, and reflects those from k on so that column k is 0 below its diagonal. */
#define ROLN_QR_R_MEM(X, rows, n) X(v, rows) X(w, n)
#define ROLN_QR_R_WORK(rows, n) (0 ROLN_QR_R_MEM(ROLNI_SIZE, rows, n))
ROLN_FN void rolni_reflect(int rows, int n, int k, roln_real *X, roln_real *work)
{
    roln_real *const from = X + k * n, *heavy = from, top = 0, s;
    const int m = rows - k;
    int i, j;
    ROLN_QR_R_MEM(ROLNI_CARVE, rows, n)
    for (i = 0; i < m; i++) {
        const roln_real x = from[i * n + k];
        if (!(ROLN_ABS(x) <= top) && top >= 0) top = ROLN_ABS(x), heavy = from + i * n; /* NaN stays */
    }
    for (j = ROLN_ABS(from[k]) < top / 4 ? k : n; j < n; j++)
        s = from[j], from[j] = heavy[j], heavy[j] = s;
    for (i = 0; i < m; i++) {
        v[i] = from[i * n + k];
        from[i * n + k] = 0;
    }
    if (top <= 0) return;
    for (i = 0; i < m; i++)
        v[i] /= top;
    s = ROLN_SQRT(roln_dot(m, v, v));
    s = v[0] > 0 ? -s : s;
    v[0] -= s; /* the reflection I + v v^T / (s v_0) takes the column to s e_1 */
    roln_mm(1, m, n, v, from, w);
    for (j = k + 1; j < n; j++)
        w[j] /= s * v[0];
    for (i = 0; i < m; i++)
        for (j = k + 1; j < n; j++)
            from[i * n + j] += v[i] * w[j];
    from[k] = s * top;
}

/* X [rows][n] becomes the upper triangular R of X = U R, U^T U = I, and zeros below: R^T R = X^T X (Householder). Step k swaps the
   row to the top whose number in column k is the largest, unless the number at the top is at least a quarter of it (Powell and Reid
   1969; Cox and Higham 1998). The rounding errors of a row are then in proportion to that row, so light rows survive beside heavy
   ones (test_riccati.c: test_rows). Scales of columns do not matter. work [ROLN_QR_R_WORK]. 2 rows n^2 multiply-adds. */
ROLN_FN void roln_qr_r(int rows, int n, roln_real *X, roln_real *work)
{
    int k;
    for (k = 0; k < n && k < rows; k++)
        rolni_reflect(rows, n, k, X, work);
}

/* Y = R^-T Y, R [n][n] upper triangular, Y [n][m]. */
ROLN_FN void rolni_solve_upper_t(int n, int m, const roln_real *R, roln_real *Y)
{
    int i, j, k;
    for (i = 0; i < n; i++) {
        for (k = 0; k < i; k++)
            for (j = 0; j < m; j++)
                Y[i * m + j] -= R[k * n + i] * Y[k * m + j];
        for (j = 0; j < m; j++)
            Y[i * m + j] /= R[i * n + i];
    }
}

/* ---- 6 eigensolver ---------------------------------------------------------------------------- */

/* Plane rotation of two neighbouring rows: (x; x+n) <- (c x - s (x+n); s x + c (x+n)). */
ROLN_FN void rolni_rotate(int n, roln_real c, roln_real s, roln_real *x)
{
    roln_real *y = x + n;
#if ROLN_SIMD
    for (; n >= ROLNI_W; n -= ROLNI_W, x += ROLNI_W, y += ROLNI_W) {
        const rolni_v a = ROLNI_LD(x), b = ROLNI_LD(y);
        ROLNI_ST(x, c * a - s * b);
        ROLNI_ST(y, s * a + c * b);
    }
#elif ROLNI_MVE
    for (; n >= 4; n -= 4, x += 4, y += 4) {
        const float32x4_t a = rolni_mve_load(rolni_mve_begin(x)), b = rolni_mve_load(y);
        float32x4_t u = vsubq_f32(vmulq_n_f32(a, c), vmulq_n_f32(b, s)), v = vaddq_f32(vmulq_n_f32(a, s), vmulq_n_f32(b, c));
        rolni_mve_end(&u), rolni_mve_end(&v);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(x, u), rolni_mve_store(y, v);
    }
#endif
    for (; n > 0; n--) {
        const roln_real a = *x, b = *y;
        *x++ = c * a - s * b;
        *y++ = s * a + c * b;
    }
}

/* Two of them in one pass: (y; z) by c1, s1, then (x; y) by c, s, y = x + n, z = y + n. */
ROLN_FN void rolni_rotate2(int n, roln_real c1, roln_real s1, roln_real c, roln_real s, roln_real *x)
{
    roln_real *y = x + n, *z = y + n;
#if ROLN_SIMD
    for (; n >= ROLNI_W; n -= ROLNI_W, x += ROLNI_W, y += ROLNI_W, z += ROLNI_W) {
        const rolni_v a = ROLNI_LD(x), b = ROLNI_LD(y), d = ROLNI_LD(z), m = c1 * b - s1 * d;
        ROLNI_ST(x, c * a - s * m);
        ROLNI_ST(y, s * a + c * m);
        ROLNI_ST(z, s1 * b + c1 * d);
    }
#elif ROLNI_MVE
    for (; n >= 4; n -= 4, x += 4, y += 4, z += 4) {
        const float32x4_t a = rolni_mve_load(rolni_mve_begin(x)), b = rolni_mve_load(y), d = rolni_mve_load(z);
        const float32x4_t m = vsubq_f32(vmulq_n_f32(b, c1), vmulq_n_f32(d, s1));
        float32x4_t u = vsubq_f32(vmulq_n_f32(a, c), vmulq_n_f32(m, s)), v = vaddq_f32(vmulq_n_f32(a, s), vmulq_n_f32(m, c));
        float32x4_t w = vaddq_f32(vmulq_n_f32(b, s1), vmulq_n_f32(d, c1));
        rolni_mve_end(&u), rolni_mve_end(&v), rolni_mve_end(&w);
        if (rolni_mve_denormal()) break;
        rolni_mve_store(x, u), rolni_mve_store(y, v), rolni_mve_store(z, w);
    }
#endif
    for (; n > 0; n--, x++, y++, z++) {
        const roln_real a = *x, b = *y, d = *z, m = c1 * b - s1 * d;
        *x = c * a - s * m;
        *y = s * a + c * m;
        *z = s1 * b + c1 * d;
    }
}

/* roln_eig in five steps. The first: Q = 2^k A, with the largest exponent at 2^30 as far as 2^k is normal, so that squares
   neither overflow nor underflow; *down = 2^-k. */
ROLN_FN roln_status rolni_eig_scale(int n, const roln_real *A, roln_real *Q, roln_real *down)
{
    roln_real up;
    roln_bits top = 0;
    int i, k;
    for (i = 0; i < n * n; i++) {
        const roln_bits b = rolni_bits(A[i]) & ~ROLNI_SIGN;
        top = b > top ? b : top;
    }
    if (top >= ROLNI_INF)
        return ROLN_E_NOT_FINITE;
    k = ROLNI_AS(int, ROLNI_BIAS) + 30 - ROLNI_AS(int, top >> ROLNI_MANT);
    k = k < ROLNI_AS(int, ROLNI_BIAS) ? k : ROLNI_AS(int, ROLNI_BIAS) - 1;
    up = rolni_real(ROLNI_AS(roln_bits, ROLNI_AS(int, ROLNI_BIAS) + k) << ROLNI_MANT);
    *down = rolni_real(ROLNI_AS(roln_bits, ROLNI_AS(int, ROLNI_BIAS) - k) << ROLNI_MANT);
    for (i = 0; i < n * n; i++)
        Q[i] = A[i] * up;
    return ROLN_OK;
}

/* What counts as zero beside entries of 2^30. */
#define ROLNI_EIG_TINY (ROLN_EPS * ROLN_EPS)

/* The second, to tridiagonal form: Q <- H Q H, H = I - v v^T / h, clears row i left of its subdiagonal e[i-1], from the last row
   up. v stays in the row, 1/h in l[i]. t: n - 1 numbers of scratch. */
ROLN_FN void rolni_eig_reduce(int n, roln_real *Q, roln_real *l, roln_real *e, roln_real *ROLN_RESTRICT t)
{
    int i, j, k;
    for (i = n - 1; i > 1; i--) {
        roln_real *ROLN_RESTRICT v = Q + i * n;
        roln_real s = 0, f = v[i - 1], g, h;
        for (k = 0; k < i - 1; k++)
            s += v[k] * v[k];
        l[i] = 0;
        e[i - 1] = f;
        if (s < ROLNI_EIG_TINY * ROLNI_EIG_TINY)
            continue;
        s += f * f;
        g = ROLN_SQRT(s);
        g = f > 0 ? -g : g;
        e[i - 1] = g;
        h = 1 / (s - f * g);
        v[i - 1] = f - g;
        l[i] = h;
        for (k = 0; k < i; k++) /* t = Q v; 0 + makes -0 a 0 */
            t[k] = 0 + v[0] * Q[k];
        for (j = 1; j < i; j++) {
            const roln_real *ROLN_RESTRICT a = Q + j * n;
            const roln_real x = v[j];
            for (k = 0; k < i; k++)
                t[k] += x * a[k];
        }
        s = 0;
        for (k = 0; k < i; k++)
            s += t[k] * v[k];
        s *= ROLN_C(0.5) * h;
        for (k = 0; k < i; k++) /* w = (t - (t.v) v / 2h) / h */
            t[k] = (t[k] - s * v[k]) * h;
        for (j = 0; j < i; j++) { /* Q -= v w^T + w v^T */
            roln_real *ROLN_RESTRICT a = Q + j * n;
            const roln_real x = v[j], y = t[j];
            for (k = 0; k < i; k++)
                a[k] -= x * t[k] + y * v[k];
        }
    }
}

/* The third: Q <- H_2 H_3 ..; its i x i block grows by one row and column per reflection. The diagonal goes to l. */
ROLN_FN void rolni_eig_accumulate(int n, roln_real *Q, roln_real *l, roln_real *e)
{
    int i, j, k;
    for (i = 0; i < n; i++) {
        roln_real *ROLN_RESTRICT v = Q + i * n;
        const roln_real h = i > 1 ? l[i] : 0;
        if (h != 0)
            for (j = 0; j < i; j++) {
                roln_real *ROLN_RESTRICT a = Q + j * n;
                roln_real s = 0;
                for (k = 0; k < i; k++)
                    s += a[k] * v[k];
                s *= h;
                for (k = 0; k < i; k++)
                    a[k] -= s * v[k];
            }
        if (i == 1)
            e[0] = v[0];
        l[i] = v[i];
        for (k = 0; k < i; k++)
            v[k] = Q[k * n + i] = 0;
        v[i] = 1;
    }
}

/* One implicit QL sweep over rows i..m of the tridiagonal matrix with diagonal l and subdiagonal e, g = l[m] - shift. Rows of Q
   are rotated with it, two rotations in one pass: the first of a pair waits in c1, s1 for the next. */
ROLN_FN void rolni_eig_sweep(int n, int i, int m, roln_real g, roln_real *l, roln_real *e, roln_real *Q)
{
    roln_real p = 0, s = 1, c = 1, s1 = 1, c1 = 1;
    int k;
    for (k = m - 1; k >= i; k--) {
        const roln_real f = s * e[k], q = c * e[k];
        roln_real r = f * f + g * g;
        if (r < ROLNI_EIG_TINY * ROLNI_EIG_TINY) { /* the block splits here; the rotation of row k + 1 has made e[k] to q */
            e[k] = q;
            break;
        }
        s = 1 / r; /* beside the root, not after it: shorter chain */
        r = ROLN_SQRT(r);
        e[k + 1] = r;
        c = r * s;
        s = f * c;
        c = g * c;
        g = l[k + 1] - p;
        r = (l[k] - g) * s + 2 * (c * q);
        p = s * r;
        l[k + 1] = g + p;
        g = c * r - q;
        if ((m - k) & 1) c1 = c, s1 = s;
        else rolni_rotate2(n, c1, s1, c, s, Q + k * n);
    }
    if (!((m - k) & 1)) rolni_rotate(n, c1, s1, Q + (k + 1) * n);
    l[k + 1] -= p;
    e[k + 1] = k < i ? g : 0;
    e[m] = 0;
}

/* Sweeps after which the fourth gives up. tests/measure counts them and their worst case by another definition. */
#define ROLNI_EIG_MOST(n) (8 * (n))
#ifndef ROLNI_EIG_SWEEPS
#define ROLNI_EIG_SWEEPS ROLNI_EIG_MOST
#endif

/* The fourth: sweeps until the subdiagonal is gone. Rows i..m are the unreduced block that begins at i. */
ROLN_FN roln_status rolni_eig_iterate(int n, roln_real *l, roln_real *e, roln_real *Q)
{
    int i, m, sweeps = ROLNI_EIG_SWEEPS(n);
    e[n - 1] = 0;
    for (i = 0; i < n;) {
        roln_real g, r, s, c;
        for (m = i; m < n - 1; m++) {
            if (ROLN_ABS(e[m]) <= ROLN_C(0.5) * ROLN_EPS * (ROLN_ABS(l[m]) + ROLN_ABS(l[m + 1])) + ROLNI_EIG_TINY)
                break;
        }
        if (m == i) {
            i++;
            continue;
        }
        if (sweeps <= 0)
            return ROLN_E_NO_CONVERGENCE;
        sweeps--;
        g = l[i + 1] - l[i];
        r = ROLN_SQRT(g * g + 4 * e[i] * e[i]);
        s = 2 * e[i] / (g < 0 ? g - r : g + r); /* tan of the rotation of rows i, i+1 */
        r = s * e[i];
        if (m > i + 1) {
            rolni_eig_sweep(n, i, m, l[m] - l[i] + r, l, e, Q);
        } else { /* 2 x 2: that rotation is the answer */
            c = 1 / ROLN_SQRT(1 + s * s);
            s *= c;
            l[i] -= r;
            l[m] += r;
            rolni_rotate(n, c, s, Q + i * n);
            i += 2;
        }
    }
    return ROLN_OK;
}

/* The fifth: eigenvalues ascending, rows of Q with them, and the scale undone. */
ROLN_FN void rolni_eig_sort(int n, roln_real down, roln_real *l, roln_real *Q)
{
    int i, k, m;
    for (i = 0; i < n; i++) {
        roln_real least = l[i];
        for (m = i, k = i + 1; k < n; k++)
            if (l[k] < least)
                m = k, least = l[k];
        if (m != i) {
            roln_real *ROLN_RESTRICT x = Q + i * n, *ROLN_RESTRICT y = Q + m * n;
            l[m] = l[i];
            for (k = 0; k < n; k++) {
                const roln_real xx = x[k];
                x[k] = y[k];
                y[k] = xx;
            }
        }
        l[i] = least * down;
    }
}

/* Symmetric eigen-decomposition A = Q^T diag(l) Q: row k of Q is the eigenvector of l[k], l ascending.
   Householder tridiagonalisation (Martin, Reinsch, Wilkinson 1968), then implicit QL with Wilkinson's
   shift (Dubrulle 1970), which rotates pairs of rows. A is scaled by a power of two, so its unit does
   not matter: denormal and near-overflow inputs keep full precision.
     A [n][n] in, symmetric, both triangles are read; may be Q    l [n] out    Q [n][n] out    n >= 1
   Residual within 16 n ROLN_EPS max|A|, eigenvalues within 8, orthogonality within 8 n ROLN_EPS (the worst that a search found is
   10.5, 4 and 5.4). Ends on every input, after at most
   8 n sweeps of n - 1 rotations; two rows take one rotation. In exact arithmetic every sweep makes |e_i^2 e_i+1| of the block
   that begins at i smaller (Hoffmann, Parlett 1978), near the end e_i by its third power. A million hostile matrices took at most
   2.7 n, a search for the worst of up to 8 rows 3.7 n (make eig).
   ROLN_E_NOT_FINITE for an input with NaN or Inf (l and Q untouched) or an eigenvalue beyond the largest
   number; ROLN_E_NO_CONVERGENCE. On these last two l and Q are scratch: a second n x n would cost more
   than it saves. About 9 n^3 multiply-adds. */
#define ROLN_EIG_MEM(X, n) X(t, n) X(e, n)
#define ROLN_EIG_WORK(n) (0 ROLN_EIG_MEM(ROLNI_SIZE, n))
ROLN_FN roln_status roln_eig(int n, const roln_real *A, roln_real *l, roln_real *Q, roln_real *work)
{
    roln_real down = 1;
    roln_status st;
    ROLN_EIG_MEM(ROLNI_CARVE, n)
    if ((st = rolni_eig_scale(n, A, Q, &down)) != ROLN_OK)
        return st;
    rolni_eig_reduce(n, Q, l, e, t);
    rolni_eig_accumulate(n, Q, l, e);
    if ((st = rolni_eig_iterate(n, l, e, Q)) != ROLN_OK)
        return st;
    rolni_eig_sort(n, down, l, Q);
    return roln_finite(l[0]) && roln_finite(l[n - 1]) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* ---- 7 SPD maps ------------------------------------------------------------------------------- */

/* Complete by itself, for use without roln.h.

   A scalar function f acts on a symmetric X as seen from a base point P = A A^T, A from roln_chol (A NULL: P = I):
       Y = f_P(X) = A f(A^-1 X A^-T) A^T        f_{BPB^T}(B X B^T) = B f_P(X) B^T for any B, so any factor A serves
       f = exp: exponential map, X a tangent    f = log: logarithmic map    f = l^t: geodesic from P (t = 0) to X (t = 1)
       P = I: exponential, logarithm, power (root, inverse) of a matrix
   One eigen-decomposition A^-1 X A^-T = Q^T diag(l) Q serves all. The frame (l, V, W) of X at P, with f from
   roln_map_values and K_ij = f[l_i, l_j] from roln_map_dd1:
       V = Q A^T, W = Q A^-1, V W^T = I:    P = V^T V    X = V^T diag(l) V    Y = V^T diag(f) V    Y^-1 = W^T diag(1/f) W
       derivative of Y in X along E:        D = V^T (K o (W E W^T)) V
       backward, Z = V gY V^T:             gX += W^T (K o Z) W,   gP += W^T (H o Z) W
   P = I: V = W = Q, and the derivative is its own adjoint. No eigenvector is differentiated: equal eigenvalues are no exception. */

/* Y = Q X Q^T, all [n][n]. work may not overlap, nor Y with Q or work; Y may be X. 2 n^3 multiply-adds. */
#define ROLN_CONGR_WORK(n) ((n) * (n))
ROLN_FN void roln_congr(int n, const roln_real *Q, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_mm(n, n, n, Q, X, work);
    roln_mm_bt(n, n, n, work, Q, Y);
}

/* Y += Q^T X Q, all [n][n]. Y may be X. Work and cost as roln_congr. */
ROLN_FN void roln_congr_t(int n, const roln_real *Q, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_mm(n, n, n, X, Q, work);
    roln_mm_at(n, n, n, Q, work, Y);
}

/* What exp can hold in this precision: l [n] ascending, l_max - l_min <= 14 (float) or 32 (double), |l| <= 40.
   ROLN_E_RANGE beyond, ROLN_E_NOT_FINITE. */
ROLN_FN roln_status roln_exp_range(int n, const roln_real *l)
{
#ifdef ROLN_DOUBLE
    const roln_real span = 32.0;
#else
    const roln_real span = 14.0f;
#endif
    if (!roln_all_finite(n, l))
        return ROLN_E_NOT_FINITE;
    return l[n - 1] - l[0] > span || l[n - 1] > 40 || l[0] < -40 ? ROLN_E_RANGE : ROLN_OK;
}

/* First divided differences of exp (Daleckii and Krein 1965) K_ij = exp[a, b], a = l_i, b = l_j:
       |a - b| >= 1: (e^a - e^b) / (a - b)      else: e^m sinhc((a-b)/2), e^m = sqrt(e^a e^b)
   The quotient keeps its digits where the gap is wide, and there the rounding of a - b would hurt the other.
   l [n] in, |l| <= 40   K [n][n] out, symmetric, K_ii = e^l_i. n exp, at most n(n-1)/2 sinhc.
   Within 7 ulp at every gap, the sum of the errors of exp, sinhc and the rest; a search finds 5 (test_elementary.c: test_dd1). */
ROLN_FN void roln_exp_dd1(int n, const roln_real *l, roln_real *K)
{
    int i, j;
    for (i = 0; i < n; i++) {
        const roln_real a = K[i * n + i] = roln_exp(l[i]);
        for (j = 0; j < i; j++) {
            const roln_real b = K[j * n + j], gap = l[i] - l[j];
            K[i * n + j] = K[j * n + i] = ROLN_ABS(gap) >= 1 ? (a - b) / gap : ROLN_SQRT(a * b) * roln_sinhc(ROLN_C(0.5) * gap);
        }
    }
}

/* Second divided differences exp[l_i, l_j, l_k]. For a <= b <= c, m = (a+c)/2, y = b - m, g = (c-a)/2:
       c - a >= 1: (exp[b,c] - exp[a,b]) / (c - a)
       else:       e^m sum_r h_r(-g, y, g) / (r+2)! = e^m sum_s C_s y^s,   C_s = 1/(s+2)! + g^2 C_{s+2}
   (h_r the complete homogeneous polynomials), cut below half an ulp. e^m = sqrt(e^a e^c).
     l [n] in, ascending   K [n][n] in, from roln_exp_dd1   K3 [n][n][n] out, one number in all six permutations
   n(n+1)(n+2)/6 values of 8 (float) or 14 (double) multiply-adds. */
ROLN_FN void roln_exp_dd2(int n, const roln_real *l, const roln_real *K, roln_real *K3)
{
#ifdef ROLN_DOUBLE
    enum { ROLNI_TERMS = 14 };
#else
    enum { ROLNI_TERMS = 8 };
#endif
    static const roln_real inv_fact[ROLNI_TERMS] = { /* 1/(s+2)! */
        ROLN_C(0.5), ROLN_C(0.16666666666666667), ROLN_C(4.1666666666666667e-2), ROLN_C(8.3333333333333333e-3),
        ROLN_C(1.3888888888888889e-3), ROLN_C(1.9841269841269841e-4), ROLN_C(2.4801587301587302e-5), ROLN_C(2.7557319223985891e-6),
#ifdef ROLN_DOUBLE
        2.7557319223985891e-7, 2.5052108385441719e-8, 2.0876756987868099e-9, 1.6059043836821615e-10,
        1.1470745597729725e-11, 7.6471637318198165e-13
#endif
    };
    roln_real C[ROLNI_TERMS + 2];
    int i, j, k, s;
    C[ROLNI_TERMS] = C[ROLNI_TERMS + 1] = 0;
    for (i = 0; i < n; i++)
        for (k = i; k < n; k++) {
            const roln_real gap = l[k] - l[i], g2 = ROLN_C(0.25) * gap * gap;
            const int apart = gap >= 1;
            const roln_real scale = apart ? 1 / gap : ROLN_SQRT(K[i * n + i] * K[k * n + k]);
            for (s = ROLNI_TERMS - 1; s >= 0; s--)
                C[s] = inv_fact[s] + g2 * C[s + 2];
            for (j = i; j <= k; j++) {
                roln_real x;
                if (apart) {
                    x = K[j * n + k] - K[i * n + j];
                } else {
                    const roln_real y = ROLN_C(0.5) * ((l[j] - l[i]) - (l[k] - l[j]));
                    x = C[ROLNI_TERMS - 1];
                    for (s = ROLNI_TERMS - 2; s >= 0; s--)
                        x = C[s] + y * x;
                }
                x *= scale;
                K3[(i * n + j) * n + k] = K3[(i * n + k) * n + j] = x;
                K3[(j * n + i) * n + k] = K3[(j * n + k) * n + i] = x;
                K3[(k * n + i) * n + j] = K3[(k * n + j) * n + i] = x;
            }
        }
}

/* Second derivative of exp in the eigenbasis: D_ij += sum_k exp[l_i, l_k, l_j] (E_ik F_kj + F_ik E_kj). K3 from roln_exp_dd2;
   E, F [n][n] in, symmetric; D [n][n] gets a symmetric increment and may not overlap. With any third symmetric G:
   <G, D2[E,F]> = <F, D2[E,G]>, so this is its own backward. 2 n^3 multiply-adds. At a base point: E, F are W E W^T, W F W^T, and
   the second derivative is V^T D V. */
ROLN_FN void roln_exp_d2(int n, const roln_real *K3, const roln_real *E, const roln_real *F, roln_real *D)
{
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            const roln_real *t = K3 + (i * n + j) * n, *ei = E + i * n, *ej = E + j * n, *fi = F + i * n, *fj = F + j * n;
            roln_real s = 0;
            for (k = 0; k < n; k++)
                s += t[k] * (ei[k] * fj[k] + fi[k] * ej[k]);
            D[i * n + j] += s;
            if (j < i)
                D[j * n + i] += s;
        }
}

enum { ROLN_EXP, ROLN_LOG, ROLN_POWER }; /* the f of a map; p is read by ROLN_POWER only: f = l^p */

/* log x or x^p, x > 0. */
ROLN_FN roln_real rolni_map(int map, roln_real p, roln_real x)
{
    if (map == ROLN_LOG) return roln_log(x);
    if (p == ROLN_C(0.5)) return ROLN_SQRT(x);
    if (p == ROLN_C(-0.5)) return 1 / ROLN_SQRT(x);
    if (p == -1) return 1 / x;
    if (p == 0) return 1;
    if (p == 1) return x;
    if (p == 2) return x * x;
    return roln_exp(p * roln_log(x));
}

/* f_i = f(l_i), i < n. l [n] ascending in, f [n] out, may be l, written only on ROLN_OK. p = 1/2: square root, -1/2: its
   inverse, -1: inverse; these, 0, 1 and 2 without exp and log, otherwise e^(p log l), within 2 (1 + |p log l|) eps unless denormal:
   the sum of the errors of exp, log and the product; a search finds 1.3 (test_elementary.c: test_dd1).
   exp: status of roln_exp_range. log, power: ROLN_E_NOT_SPD unless l_min > n eps l_max. ROLN_E_NOT_FINITE.
   Eigenvalues from roln_eig are known to a few n eps l_max: what that costs the smallest of them stands at roln_spd_map. */
ROLN_FN roln_status roln_map_values(int n, int map, roln_real p, const roln_real *l, roln_real *f)
{
    int i, k;
    if (map == ROLN_EXP) {
        const roln_status st = roln_exp_range(n, l);
        for (i = 0; i < n && st == ROLN_OK; i++)
            f[i] = roln_exp(l[i]);
        return st;
    }
    if (!roln_all_finite(n, l))
        return ROLN_E_NOT_FINITE;
    if (!(l[0] > ROLNI_AS(roln_real, n) * ROLN_EPS * l[n - 1]))
        return ROLN_E_NOT_SPD;
    for (k = -2; k < n; k++) { /* first the two ends: between them a power is finite if it is there */
        const roln_real y = rolni_map(map, p, l[k == -2 ? n - 1 : k == -1 ? 0 : k]);
        if (k >= 0)
            f[k] = y;
        else if (!roln_finite(y))
            return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}

/* log[a, b], a, b > 0: 2 atanh(s) / (a - b), s = (a - b) / (a + b); the quotient beyond a factor of 2. */
ROLN_FN roln_real rolni_log_dd1(roln_real a, roln_real b)
{
    const roln_real m = ROLN_C(0.5) * a + ROLN_C(0.5) * b, s = ROLN_C(0.5) * (a - b) / m;
    if (3 * ROLN_ABS(s) > 1)
        return roln_log(a / b) / (a - b);
    return (1 + ROLN_C(0.5) * rolni_atanh_tail(s * s)) / m;
}

/* f[a, b] of f = l^p: p exp[p log a, p log b] log[a, b], f_a = a^p and f_b = b^p given. */
ROLN_FN roln_real rolni_power_dd1(roln_real p, roln_real a, roln_real b, roln_real fa, roln_real fb)
{
    roln_real d, x;
    if (p == ROLN_C(0.5)) return 1 / (fa + fb);
    if (p == ROLN_C(-0.5)) return -fa * (fb / (1 / fa + 1 / fb));
    if (p == -1) return -fa * fb;
    if (p == 1) return 1;
    d = p * rolni_log_dd1(a, b);
    x = d * (a - b); /* p log(a / b) */
    return ROLN_ABS(x) >= 1 ? (fa - fb) / (a - b) : d * (ROLN_SQRT(fa) * ROLN_SQRT(fb)) * roln_sinhc(ROLN_C(0.5) * x);
}

/* First divided differences K_ij = f[l_i, l_j], K_ii = f'(l_i), without a difference of close numbers. l, f [n] in, from
   roln_map_values; K [n][n] out, symmetric to the bit. Within as many eps, where nothing is denormal: log 3, powers 1/2: 1.6,
   -1/2: 5, -1: 1.6, 2: 7, other p: 11 (1 + |p log l|), the sums of the errors of the parts; a search finds 1.9, 1.3, 3.4, 1.5, 3.5
   and 4.3 (test_elementary.c: test_dd1). exp: as roln_exp_dd1. */
ROLN_FN void roln_map_dd1(int n, int map, roln_real p, const roln_real *l, const roln_real *f, roln_real *K)
{
    int i, j;
    if (map == ROLN_EXP) {
        roln_exp_dd1(n, l, K);
        return;
    }
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++)
            K[i * n + j] = K[j * n + i] = map == ROLN_LOG ? rolni_log_dd1(l[i], l[j]) : rolni_power_dd1(p, l[i], l[j], f[i], f[j]);
}

/* R = A^-1, A lower triangular: A_ii R_i = I_i - sum_{j<i} A_ij R_j. n^3/6 multiply-adds. */
ROLN_FN void rolni_lower_inv(int n, const roln_real *A, roln_real *R)
{
    int i, j, k;
    for (i = 0; i < n; i++) {
        for (k = 0; k < n; k++)
            R[i * n + k] = k == i;
        for (j = 0; j < i; j++)
            for (k = 0; k <= j; k++)
                R[i * n + k] -= A[i * n + j] * R[j * n + k];
        for (k = 0; k <= i; k++)
            R[i * n + k] /= A[i * n + i];
    }
}

/* S = R X R^T, symmetric to the bit. S may be X. Work of roln_congr. */
ROLN_FN void rolni_spd_whiten(int n, const roln_real *R, const roln_real *X, roln_real *S, roln_real *work)
{
    int i, j;
    roln_congr(n, R, X, S, work);
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            S[i * n + j] = S[j * n + i] = ROLN_C(0.5) * (S[i * n + j] + S[j * n + i]);
}

/* l, Q of A^-1 X A^-T, and R = A^-1, unused where A is NULL. Status of roln_eig. */
#define ROLNI_SPD_EIG_WORK(n) ROLN_MAX(ROLN_CONGR_WORK(n), ROLN_EIG_WORK(n))
ROLN_FN roln_status rolni_spd_eig(int n, const roln_real *A, const roln_real *X, roln_real *l, roln_real *Q, roln_real *R,
                                  roln_real *work)
{
    if (A == NULL)
        return roln_eig(n, X, l, Q, work);
    rolni_lower_inv(n, A, R);
    rolni_spd_whiten(n, R, X, Q, work);
    return roln_eig(n, Q, l, Q, work);
}

/* Frame (l, V, W) of X at P = A A^T, A lower triangular with zeros above (roln_chol), or NULL: V = W = Q.
     A, X [n][n] in, X symmetric   l [n] ascending, V, W [n][n] out   no overlap, but W may be V where A is NULL
   Status of roln_eig; the outputs are written only on ROLN_OK. About 15 n^3 multiply-adds. */
#define ROLN_SPD_FRAME_MEM(X, n) X(Q, (n) * (n)) X(R, (n) * (n)) X(d, n)
#define ROLN_SPD_FRAME_WORK(n) (0 ROLN_SPD_FRAME_MEM(ROLNI_SIZE, n) + ROLNI_SPD_EIG_WORK(n))
ROLN_FN roln_status roln_spd_frame(int n, const roln_real *A, const roln_real *X, roln_real *l, roln_real *V, roln_real *W,
                                   roln_real *work)
{
    roln_status st;
    ROLN_SPD_FRAME_MEM(ROLNI_CARVE, n)
    if ((st = rolni_spd_eig(n, A, X, d, Q, R, work)) != ROLN_OK)
        return st;
    rolni_copy(n, d, l);
    if (A != NULL) {
        roln_mm_bt(n, n, n, Q, A, V);
        roln_mm(n, n, n, Q, R, W);
    } else {
        rolni_copy(n * n, Q, V);
        rolni_copy(n * n, Q, W);
    }
    return ROLN_OK;
}

/* Y = V^T diag(f) V, f [n] of any sign: sqrt|f| goes to both factors, the sign to one, so that Y is symmetric to the bit,
   and a Gram matrix where f >= 0. (f, V) gives f_P(X), (1/f, W) its inverse. Y [n][n] out, no overlap. n^3 multiply-adds. */
#define ROLN_SPD_FORM_MEM(X, n) X(left, (n) * (n)) X(right, (n) * (n))
#define ROLN_SPD_FORM_WORK(n) (0 ROLN_SPD_FORM_MEM(ROLNI_SIZE, n))
ROLN_FN void roln_spd_form(int n, const roln_real *f, const roln_real *V, roln_real *Y, roln_real *work)
{
    int i, k;
    ROLN_SPD_FORM_MEM(ROLNI_CARVE, n)
    for (k = 0; k < n; k++) {
        const roln_real h = ROLN_SQRT(ROLN_ABS(f[k])), s = f[k] < 0 ? -h : h;
        for (i = 0; i < n; i++)
            left[k * n + i] = h * V[k * n + i], right[k * n + i] = s * V[k * n + i];
    }
    rolni_zero(n * n, Y);
    roln_mm_at(n, n, n, left, right, Y);
}

/* y = V^T (f o (V x)) without forming the matrix: (f, V) multiplies by f_P(X), (1/f, W) by its inverse, and where f >= 0,
   x^T y >= 0 whatever the rounding of f. x, y [n]; y may be x; work [n]. 2 n^2 multiply-adds. */
ROLN_FN void roln_spd_mul(int n, const roln_real *f, const roln_real *V, const roln_real *x, roln_real *y, roln_real *work)
{
    int i;
    roln_mm_bt(1, n, n, x, V, work);
    for (i = 0; i < n; i++)
        work[i] *= f[i];
    roln_mm(1, n, n, work, V, y);
}

/* The whole: Y = f_P(X). A [n][n] or NULL, X [n][n] in, symmetric, Y [n][n] out, symmetric to the bit, may be X.
   P = I: every Y_ij is within 8 n eps (max|l| max|f'| + max|f|) of f(X), maxima over the eigenvalues l; with k = l_max / l_min:
       log                8 n eps (k + max|log l|)
       l^p, p < 0         8 n eps (1 + |p| k) max l^p
       l^p, 0 < p <= 1    8 n eps (1 + p k^(1-p)) max l^p
   and where l^p is e^(p log l) (roln_map_values) with max|f| (1 + max|p log l|) for max|f|: as roln_eig bounds Q and l. Of a
   million matrices the worst was 4.7 (make numerics).
   An inverse thus has three digits where n k < 3e-4 / eps (2,500 in float), and none close to n k = 1 / eps, where the status
   becomes ROLN_E_NOT_SPD. At other base points the condition of P multiplies the error, as the frame is rounded.
   Status of roln_spd_frame and roln_map_values, and ROLN_E_NOT_FINITE if Y overflows; Y is written only on ROLN_OK. */
#define ROLN_SPD_MAP_MEM(X, n) X(Q, (n) * (n)) X(R, (n) * (n)) X(l, n)
#define ROLN_SPD_MAP_WORK(n) (0 ROLN_SPD_MAP_MEM(ROLNI_SIZE, n) + ROLN_MAX(ROLNI_SPD_EIG_WORK(n), ROLN_SPD_FORM_WORK(n)))
ROLN_FN roln_status roln_spd_map(int n, int map, roln_real p, const roln_real *A, const roln_real *X, roln_real *Y, roln_real *work)
{
    roln_real *V, *y; /* V takes the room of R, or is Q; y takes the other */
    roln_status st;
    ROLN_SPD_MAP_MEM(ROLNI_CARVE, n)
    if ((st = rolni_spd_eig(n, A, X, l, Q, R, work)) != ROLN_OK || (st = roln_map_values(n, map, p, l, l)) != ROLN_OK)
        return st;
    V = A == NULL ? Q : R;
    y = A == NULL ? R : Q;
    if (A != NULL)
        roln_mm_bt(n, n, n, Q, A, V);
    roln_spd_form(n, l, V, y, work);
    if (!roln_all_finite(n * n, y))
        return ROLN_E_NOT_FINITE;
    rolni_copy(n * n, y, Y);
    return ROLN_OK;
}

/* Derivative of Y = f_P(X) in X along E: D = V^T (K o (W E W^T)) V. E, D [n][n] symmetric; D may be E.
   P = I: every D_ij is within 3 n eps (max|l| max|f''| + max|f'|) |E|_F, maxima and other powers as at roln_spd_map (spd_million.c:
   check_map). */
#define ROLN_SPD_MAP_D_MEM(X, n) X(Y, (n) * (n))
#define ROLN_SPD_MAP_D_WORK(n) (0 ROLN_SPD_MAP_D_MEM(ROLNI_SIZE, n) + ROLN_CONGR_WORK(n))
ROLN_FN void roln_spd_map_d(int n, const roln_real *K, const roln_real *V, const roln_real *W, const roln_real *E, roln_real *D,
                            roln_real *work)
{
    int i;
    ROLN_SPD_MAP_D_MEM(ROLNI_CARVE, n)
    roln_congr(n, W, E, Y, work);
    for (i = 0; i < n * n; i++)
        Y[i] *= K[i], D[i] = 0;
    roln_congr_t(n, V, Y, D, work);
}

/* Backward of Y = f_P(X), Z = V gY V^T:
       gX += W^T (K o Z) W        gP += W^T (H o Z) W,   H_ij = (f_i + f_j)/2 - K_ij (l_i + l_j)/2
   The second is sym(P^-1 (Y gY - X gX)), from the equivariance above, in the frame.
     l, f, K, V, W in   gY [n][n] in, symmetric   gX, gP [n][n] added to, no overlap; gP NULL where P is fixed */
#define ROLN_SPD_MAP_BWD_MEM(X, n) X(Z, (n) * (n)) X(Y, (n) * (n))
#define ROLN_SPD_MAP_BWD_WORK(n) (0 ROLN_SPD_MAP_BWD_MEM(ROLNI_SIZE, n) + ROLN_CONGR_WORK(n))
ROLN_FN void roln_spd_map_bwd(int n, const roln_real *l, const roln_real *f, const roln_real *K, const roln_real *V,
                              const roln_real *W, const roln_real *gY, roln_real *gX, roln_real *gP, roln_real *work)
{
    int i, j;
    ROLN_SPD_MAP_BWD_MEM(ROLNI_CARVE, n)
    roln_congr(n, V, gY, Z, work);
    for (i = 0; i < n * n; i++)
        Y[i] = K[i] * Z[i];
    roln_congr_t(n, W, Y, gX, work);
    if (gP == NULL)
        return;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            Y[i * n + j] = ROLN_C(0.5) * ((f[i] + f[j]) * Z[i * n + j] - (l[i] + l[j]) * Y[i * n + j]);
    roln_congr_t(n, W, Y, gP, work);
}

/* ---- 8 SPD geometry --------------------------------------------------------------------------- */

/* Complete by itself, for use without roln.h. The affine-invariant metric at P = A A^T (A NULL: P = I) is
   <U, V>_P = tr(P^-1 U P^-1 V); X -> B X B^T is an isometry for every invertible B, X -> X^-1 too. Its exponential map,
   logarithmic map and geodesics are the maps exp, log and power t of section 7. Names as there. */

/* Distance *d = |log(A^-1 X A^-T)|_F of P and X. Status of roln_eig and roln_map_values; *d is written only on ROLN_OK. */
#define ROLN_SPD_DIST_MEM(X, n) X(Q, (n) * (n)) X(R, (n) * (n)) X(l, n)
#define ROLN_SPD_DIST_WORK(n) (0 ROLN_SPD_DIST_MEM(ROLNI_SIZE, n) + ROLNI_SPD_EIG_WORK(n))
ROLN_FN roln_status roln_spd_dist(int n, const roln_real *A, const roln_real *X, roln_real *d, roln_real *work)
{
    roln_status st;
    ROLN_SPD_DIST_MEM(ROLNI_CARVE, n)
    if ((st = rolni_spd_eig(n, A, X, l, Q, R, work)) != ROLN_OK || (st = roln_map_values(n, ROLN_LOG, 0, l, l)) != ROLN_OK)
        return st;
    *d = ROLN_SQRT(roln_dot(n, l, l));
    return ROLN_OK;
}

/* ---- 9 polynomials ---------------------------------------------------------------------------- */

/* p(z): all products of Chebyshev polynomials T_a1(z_1) .. T_an(z_n) of total degree 2 .. d, T_0 = 1, T_1 = z,
   T_{k+1} = 2 z T_k - T_{k-1}. On [-1, 1], where |T_k| <= 1, they are well conditioned in float. */

#define ROLN_DEGREE_MAX 8

/* F = (n + d choose d) - 1 - n, factor by factor, each step an integer; 0 for d = 0. */
#define ROLNI_CHOOSE(n, d, k) *((d) >= (k) ? (n) + (k) : 1) / ((d) >= (k) ? (k) : 1)
#define ROLN_MONOMIALS(n, d) \
    ((d) > 0 ? 1 ROLNI_CHOOSE(n, d, 1) ROLNI_CHOOSE(n, d, 2) ROLNI_CHOOSE(n, d, 3) ROLNI_CHOOSE(n, d, 4) ROLNI_CHOOSE(n, d, 5) \
                   ROLNI_CHOOSE(n, d, 6) ROLNI_CHOOSE(n, d, 7) ROLNI_CHOOSE(n, d, 8) - 1 - (n) : 0)

/* Terms are ordered by degree e = 2 .. d, those of one degree by their last variable i = 0 .. n-1, those by the power k = 1 .. e of
   it, and those as their other factor, a term of degree e - k in the variables before i, is ordered. So
   - the terms of degree e in the variables 0 .. i are the first ones of that degree, and their last is T_e(z_i);
   - the terms with the factor T_k(z_i) are the first ones of degree e - k, as many as there were before i, times T_k(z_i).
   A walk over i and e keeps upto[e], the number of terms of degree e in the variables so far (1 for e = 0), and at[e], where those
   of degree e begin in p; of degree 1 they are z itself. */
typedef struct {
    int upto[ROLN_DEGREE_MAX + 1], at[ROLN_DEGREE_MAX + 1];
} rolni_walk;

/* Variable i joins: by Pascal's rule upto[e] of i variables and upto[e - 1] of i + 1; and leaves again. */
ROLN_FN void rolni_walk_in(int degree, rolni_walk *w)
{
    int e;
    for (e = 1; e <= degree; e++)
        w->upto[e] += w->upto[e - 1];
}

ROLN_FN void rolni_walk_out(int degree, rolni_walk *w)
{
    int e;
    for (e = degree; e >= 1; e--)
        w->upto[e] -= w->upto[e - 1];
}

/* A walk with no variable yet, but the places of n. */
ROLN_FN rolni_walk rolni_walk_of(int n, int degree)
{
    rolni_walk w;
    int e, count = n;
    w.upto[0] = 1, w.at[0] = w.at[1] = 0;
    for (e = 1; e <= degree; e++)
        w.upto[e] = 0;
    for (w.at[2] = 0, e = 3; e <= degree; e++) {
        count = count * (n + e - 2) / (e - 1); /* terms of degree e - 1 */
        w.at[e] = w.at[e - 1] + count;
    }
    return w;
}

/* The index of the first term of degree e, and that of T_e(z_i), i the walk's last variable. Both count in z for e = 1, else in
   p. */
ROLNI_INLINE int rolni_first(const rolni_walk *w, int e)
{
    return e == 1 ? 0 : w->at[e];
}

ROLNI_INLINE int rolni_power_of(const rolni_walk *w, int e, int i)
{
    return e == 1 ? i : w->at[e] + w->upto[e] - 1;
}

/* f = t g of jets: one t, m numbers g and f, planes ts, gs, fs apart. f' = t' g + t g', f'' = t'' g + 2 t' g' + t g''. */
ROLN_FN void rolni_times(int jets, int m, const roln_real *t, int ts, const roln_real *g, int gs, roln_real *f, int fs)
{
    const roln_real t0 = t[0], t1 = jets > 1 ? t[ts] : 0, t2 = jets > 2 ? t[2 * ts] : 0;
    int j;
    for (j = 0; j < m; j++)
        f[j] = t0 * g[j];
    for (j = 0; j < m && jets > 1; j++)
        f[fs + j] = t1 * g[j] + t0 * g[gs + j];
    for (j = 0; j < m && jets > 2; j++)
        f[2 * fs + j] = t2 * g[j] + 2 * t1 * g[gs + j] + t0 * g[2 * gs + j];
}

/* Its backward: from the cotangents cf of f adds to those of g, cg, and of t, ct. */
ROLN_FN void rolni_times_bwd(int jets, int m, const roln_real *t, int ts, const roln_real *g, int gs, const roln_real *cf, int fs,
                             roln_real *ct, roln_real *cg)
{
    const roln_real t0 = t[0], t1 = jets > 1 ? t[ts] : 0, t2 = jets > 2 ? t[2 * ts] : 0;
    roln_real s0 = 0, s1 = 0, s2 = 0;
    int j;
    for (j = 0; j < m; j++) {
        s0 += cf[j] * g[j];
        cg[j] += cf[j] * t0;
    }
    for (j = 0; j < m && jets > 1; j++) {
        const roln_real c = cf[fs + j];
        s0 += c * g[gs + j], s1 += c * g[j];
        cg[j] += c * t1, cg[gs + j] += c * t0;
    }
    for (j = 0; j < m && jets > 2; j++) {
        const roln_real c = cf[2 * fs + j];
        s0 += c * g[2 * gs + j], s1 += 2 * c * g[gs + j], s2 += c * g[j];
        cg[j] += c * t2, cg[gs + j] += 2 * c * t1, cg[2 * gs + j] += c * t0;
    }
    ct[0] += s0;
    if (jets > 1) ct[ts] += s1;
    if (jets > 2) ct[2 * ts] += s2;
}

/* p(z) of one sample: planes of z are zs apart, of p ps. */
ROLN_FN void rolni_polynomials(int n, int degree, int jets, const roln_real *z, int zs, roln_real *p, int ps)
{
    const roln_real *const from[2] = {z, p}; /* where terms of degree 1 are, and above */
    const int step[2] = {zs, ps};
    rolni_walk w = rolni_walk_of(n, degree);
    int i, e, k, q;
    for (i = 0; i < n; i++) {
        rolni_walk_in(degree, &w);
        for (e = 2; e <= degree; e++) {
            roln_real *f = p + w.at[e] + w.upto[e] - w.upto[e - 1];
            for (k = 1; k < e; k++) { /* T_k(z_i) times what there was of degree e - k */
                const int m = w.upto[e - k] - w.upto[e - k - 1];
                rolni_times(jets, m, from[k > 1] + rolni_power_of(&w, k, i), step[k > 1],
                            from[e - k > 1] + rolni_first(&w, e - k), step[e - k > 1], f, ps);
                f += m;
            }
            rolni_times(jets, 1, z + i, zs, from[e > 2] + rolni_power_of(&w, e - 1, i), step[e > 2], f, ps);
            for (q = 0; q < jets; q++) { /* T_e = 2 z T_{e-1} - T_{e-2} */
                const int at = e > 2 ? rolni_power_of(&w, e - 2, i) + q * step[e > 3] : 0;
                f[q * ps] = 2 * f[q * ps] - (e > 2 ? from[e > 3][at] : ROLNI_AS(roln_real, q == 0));
            }
        }
    }
}

/* Its backward: adds to cz the cotangents of z, from those of p, cp, which are spent. */
ROLN_FN void rolni_polynomials_bwd(int n, int degree, int jets, const roln_real *z, int zs, const roln_real *p, int ps,
                                   roln_real *cp, roln_real *cz)
{
    const roln_real *const from[2] = {z, p};
    roln_real *const to[2] = {cz, cp};
    const int step[2] = {zs, ps};
    rolni_walk w = rolni_walk_of(n, degree);
    int i, e, k, q;
    for (i = 0; i < n; i++)
        rolni_walk_in(degree, &w);
    for (i = n - 1; i >= 0; rolni_walk_out(degree, &w), i--)
        for (e = degree; e >= 2; e--) {
            roln_real *cf = cp + rolni_power_of(&w, e, i);
            const int one = rolni_power_of(&w, e - 1, i);
            for (q = 0; q < jets; q++) { /* T_e = 2 z T_{e-1} - T_{e-2} */
                if (e > 2) to[e > 3][rolni_power_of(&w, e - 2, i) + q * step[e > 3]] -= cf[q * ps];
                cf[q * ps] *= 2;
            }
            rolni_times_bwd(jets, 1, z + i, zs, from[e > 2] + one, step[e > 2], cf, ps, cz + i, to[e > 2] + one);
            cf = cp + w.at[e] + w.upto[e] - w.upto[e - 1];
            for (k = 1; k < e; k++) {
                const int m = w.upto[e - k] - w.upto[e - k - 1], t = rolni_power_of(&w, k, i), g = rolni_first(&w, e - k);
                rolni_times_bwd(jets, m, from[k > 1] + t, step[k > 1], from[e - k > 1] + g, step[e - k > 1], cf, ps,
                                to[k > 1] + t, to[e - k > 1] + g);
                cf += m;
            }
        }
}

/* px_f = Dp_f(z)[x], from z, x [n] and p(z). Derivatives in several directions share the values p; jets compute them anew. */
ROLN_FN void rolni_polynomials_along(int n, int degree, const roln_real *z, const roln_real *p, const roln_real *x, roln_real *px)
{
    const roln_real *const from[2] = {z, p}, *const along[2] = {x, px};
    rolni_walk w = rolni_walk_of(n, degree);
    int i, e, k, j;
    for (i = 0; i < n; i++) {
        rolni_walk_in(degree, &w);
        for (e = 2; e <= degree; e++) {
            roln_real *f = px + w.at[e] + w.upto[e] - w.upto[e - 1];
            const int one = rolni_power_of(&w, e - 1, i);
            for (k = 1; k < e; k++) {
                const int m = w.upto[e - k] - w.upto[e - k - 1], t = rolni_power_of(&w, k, i), g = rolni_first(&w, e - k);
                const roln_real t0 = from[k > 1][t], t1 = along[k > 1][t];
                for (j = 0; j < m; j++)
                    f[j] = t1 * from[e - k > 1][g + j] + t0 * along[e - k > 1][g + j];
                f += m;
            }
            *f = 2 * (x[i] * from[e > 2][one] + z[i] * along[e > 2][one]); /* T_e = 2 z T_{e-1} - T_{e-2} */
            if (e > 2) *f -= along[e > 3][rolni_power_of(&w, e - 2, i)];
        }
    }
}

/* A term and the powers of its variables. The first is z_0 of degree 1. */
#define ROLN_VARIABLES_MAX 64 /* variables at most */
typedef struct {
    int degree;
    unsigned char power[ROLN_VARIABLES_MAX];
} rolni_powers;

ROLN_FN rolni_powers rolni_first_powers(void)
{
    rolni_powers t;
    memset(&t, 0, sizeof t);
    t.degree = t.power[0] = 1;
    return t;
}

/* The next term of n variables: of a degree the powers, the last one first, are in lexicographic order. */
ROLN_FN void rolni_next_powers(int n, rolni_powers *t)
{
    unsigned char *const a = t->power;
    int i = 0, left;
    while (i < n - 1 && a[i] == 0)
        i++;
    left = i == n - 1 ? ++t->degree : a[i] - 1; /* behind the last one of a degree the first one of the next */
    if (i < n - 1) a[i + 1]++;
    a[i] = 0, a[0] = ROLNI_AS(unsigned char, left);
}

/* pab_f = D^2 p_f(z)[a, b], from z, a, b [n], p(z) and its derivatives pa, pb along a, b. */
ROLN_FN void rolni_polynomials_mixed(int n, int degree, const roln_real *z, const roln_real *p, const roln_real *const by[2],
                                     const roln_real *const pby[2], roln_real *pab)
{
    const roln_real *const from[2] = {z, p}, *const a[2] = {by[0], pby[0]}, *const b[2] = {by[1], pby[1]};
    rolni_walk w = rolni_walk_of(n, degree);
    int i, e, k, j;
    for (i = 0; i < n; i++) {
        rolni_walk_in(degree, &w);
        for (e = 2; e <= degree; e++) {
            roln_real *f = pab + w.at[e] + w.upto[e] - w.upto[e - 1];
            const int one = rolni_power_of(&w, e - 1, i), high = e > 2;
            for (k = 1; k < e; k++) {
                const int m = w.upto[e - k] - w.upto[e - k - 1], t = rolni_power_of(&w, k, i), g = rolni_first(&w, e - k);
                const int s = k > 1, c = e - k > 1;
                for (j = 0; j < m; j++)
                    f[j] = a[s][t] * b[c][g + j] + b[s][t] * a[c][g + j] + (s ? pab[t] * from[c][g + j] : 0) +
                           (c ? from[s][t] * pab[g + j] : 0);
                f += m;
            }
            *f = 2 * (by[0][i] * b[high][one] + by[1][i] * a[high][one] + (high ? z[i] * pab[one] : 0));
            if (e > 3) *f -= pab[rolni_power_of(&w, e - 2, i)];
        }
    }
}

#endif

#if defined(ROLN_DOUBLE) != defined(ROLNI_DOUBLE)
#error "ROLN_DOUBLE: before the first header of roln, and unchanged from there on; or as an option of the compiler, -DROLN_DOUBLE"
#endif
