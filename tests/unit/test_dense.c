/* SPDX-License-Identifier: MIT */
/* The dense kernels (roln_spd.h, sections 2, 3 and 5) and large symmetric systems (roln_riem.h, section 6): bits of finite numbers,
   random numbers, products and solutions against naive sums in long double (bound: k eps sum |a||b|) and, to the bit, against
   scalar sums in the documented order. */
#include <stdlib.h>
#include "roln_riem.h"
#include "twin.h"
#include "room.h"

void TEST_NAME(dense)(void);

/* ---- products ---- */

/* order 1: c, then index ascending; order 2: eight partial sums. a and b with strides. */
static roln_real order1(int k, roln_real c, const roln_real *a, int sa, const roln_real *b, int sb)
{
    int i;
    for (i = 0; i < k; i++) c += a[i * sa] * b[i * sb];
    return c;
}

static roln_real order2(int k, const roln_real *a, const roln_real *b)
{
    roln_real s[8] = {0, 0, 0, 0, 0, 0, 0, 0};
    int i;
    for (i = 0; i < k; i++) s[i % 8] += a[i] * b[i];
    return ((s[0] + s[4]) + (s[2] + s[6])) + ((s[1] + s[5]) + (s[3] + s[7]));
}

/* |c - (c0 + sum a b)| in units of eps (|c0| + sum |a||b|) */
static ld error_of(int k, roln_real c, roln_real c0, const roln_real *a, int sa, const roln_real *b, int sb)
{
    ld s = (ld)c0, size = fabsl((ld)c0) + 1e-30L;
    int i;
    for (i = 0; i < k; i++) s += (ld)a[i * sa] * (ld)b[i * sb], size += fabsl((ld)a[i * sa] * (ld)b[i * sb]);
    return fabsl((ld)c - s) / (size * EPS);
}

static void check_products(int mm, int k, int n, uint64_t *s)
{
    const roln_real *A = normal(mm * k, 1, s), *At = normal(k * mm, 1, s), *B = normal(k * n, 1, s), *Bt = normal(n * k, 1, s);
    const roln_real *C0 = normal(mm * n, 1, s);
    roln_real *C = fresh(mm * n), *Ct = fresh(mm * n), *Ca = copy(mm * n, C0), *row = fresh(n), *col = fresh(k);
    const ld bound1 = k < 4 ? 2 : 0.5L * k, bound2 = 0.5L * (k / 8 + 4);
    ld worst1 = 0, worst2 = 0, e;
    int i, j, ok = 1, bits = 1;
    roln_mm(mm, k, n, A, B, C);
    roln_mm_bt(mm, k, n, A, Bt, Ct);
    roln_mm_at(mm, k, n, At, B, Ca);
    for (i = 0; i < mm; i++) {
        for (j = 0; j < n; j++) {
            const roln_real c = C[i * n + j], ct = Ct[i * n + j], ca = Ca[i * n + j];
            bits &= c == order1(k, 0, A + i * k, 1, B + j, n) && ct == order2(k, A + i * k, Bt + j * k) &&
                    ct == roln_dot(k, A + i * k, Bt + j * k);
            bits &= ca == order1(k, C0[i * n + j], At + i, mm, B + j, n);
            e = error_of(k, c, 0, A + i * k, 1, B + j, n), worst1 = e > worst1 ? e : worst1;
            e = error_of(k, ca, C0[i * n + j], At + i, mm, B + j, n), worst1 = e > worst1 ? e : worst1;
            e = error_of(k, ct, 0, A + i * k, 1, Bt + j * k, 1), worst2 = e > worst2 ? e : worst2;
        }
        roln_mm(1, k, n, A + i * k, B, row); /* together as one by one */
        ok &= same(n, row, C + i * n);
        roln_mm_bt(1, k, n, A + i * k, Bt, row);
        ok &= same(n, row, Ct + i * n);
        for (j = 0; j < k; j++) col[j] = At[j * mm + i];
        memcpy(row, C0 + i * n, (size_t)n * sizeof *row);
        roln_mm_at(1, k, n, col, B, row);
        ok &= same(n, row, Ca + i * n);
    }
    CHECK(bits);
    CHECK(ok);
    BOUND("order 1 (of its bound)", worst1 / bound1, 1);
    BOUND("order 2 (of its bound)", worst2 / bound2, 1);
    fresh_done();
}

/* NaN and infinity pass through, also at the ends of a row. */
static void test_nan(void)
{
    int n, p;
    for (n = 1; n <= 20; n++)
        for (p = 0; p < n; p++) {
            roln_real *a = zeros(n), *b = zeros(n), *c = zeros(n), one = 1;
            a[p] = (roln_real)NAN;
            CHECK(!roln_finite(roln_dot(n, a, b)));
            CHECK(!roln_all_finite(n, a) && roln_all_finite(n, b));
            roln_mm(1, 1, n, &one, a, c);
            CHECK(!roln_finite(c[p]) && c[n - 1 - p] + 1 != 0);
            fresh_done();
        }
}

/* ---- Cholesky, triangular solves, inverse ---- */

static void check_spd(int n, double weak, uint64_t *s)
{
    const roln_real *B = normal(n * n, 1, s), *b = normal(n, 1, s);
    roln_real *A = zeros(n * n), *L = fresh(n * n), *L2, *x = fresh(n), *y = fresh(n);
    ld worst = 0, e;
    int i, j;
    roln_mm_bt(n, n, n, B, B, A);
    for (i = 0; i < n; i++) A[i * n + i] += (roln_real)weak;
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) A[i * n + j] = poison(); /* only the lower triangle is read */
    CHECK(roln_chol(n, A, L) == ROLN_OK);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            if (j > i) CHECK(L[i * n + j] == 0);
            else e = error_of(j + 1, A[i * n + j], 0, L + i * n, 1, L + j * n, 1), worst = e > worst ? e : worst;
        }
    BOUND("chol: A - L L^T (eps sum |L||L|)", worst, 4);
    L2 = copy(n * n, A);
    CHECK(roln_chol(n, L2, L2) == ROLN_OK && same(n * n, L, L2)); /* in place */
    for (i = 0; i < n; i++)
        for (j = i + 1; j < n; j++) L[i * n + j] = poison(); /* the solves read the lower triangle */
    roln_solve_lower(n, L, b, x);
    roln_solve_lower_t(n, L, b, y);
    for (worst = 0, i = 0; i < n; i++) {
        e = error_of(i + 1, b[i], 0, L + i * n, 1, x, 1), worst = e > worst ? e : worst;
        e = error_of(n - i, b[i], 0, L + i * n + i, n, y + i, 1), worst = e > worst ? e : worst;
    }
    BOUND("triangular solves: b - L x (eps sum |L||x|)", worst, 4);
    L2 = copy(n, b);
    roln_solve_lower(n, L, L2, L2);
    CHECK(same(n, L2, x));
    L2 = copy(n, b);
    roln_solve_lower_t(n, L, L2, L2);
    CHECK(same(n, L2, y));
    fresh_done();
}

static void test_chol_status(uint64_t *s)
{
    const roln_real bad[4] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, -1};
    int n, i, j, b;
    for (n = 1; n <= 6; n++)
        for (i = 0; i < n; i++) {
            for (j = 0; j <= i; j++)
                for (b = 0; b < 4; b++) {
                    roln_real *A = zeros(n * n), *L = fresh(n * n);
                    int k;
                    for (k = 0; k < n; k++) A[k * n + k] = 1 + roln_uniform(s);
                    A[i * n + j] = bad[b] == -1 && j < i ? 3 : bad[b];
                    CHECK(roln_chol(n, A, L) == ROLN_E_NOT_SPD);
                    if (b == 3 && i == j) A[i * n + i] = 0, CHECK(roln_chol(n, A, L) == ROLN_E_NOT_SPD);
                    fresh_done();
                }
        }
}

static void check_inv(int n, uint64_t *s)
{
    const roln_real *A = normal(n * n, 1, s);
    roln_real *X = fresh(n * n), *w = fresh(ROLN_INV_WORK(n));
    ld *T = (ld[24 * 24]){0}, *R = (ld[24 * 24]){0}, na = 0, nx = 0;
    int i, j;
    roln_status st = roln_inv(n, A, X, w);
    widen(n * n, A, T);
    for (i = 0; i < n * n; i++) R[i] = i % (n + 1) == 0;
    t_solve(n, n, T, R);
    for (j = 0; j < n; j++) {
        ld a = 0, x = 0;
        for (i = 0; i < n; i++) a += fabsl((ld)A[i * n + j]), x += fabsl(R[i * n + j]);
        na = a > na ? a : na, nx = x > nx ? x : nx;
    }
    CHECK(st == ROLN_OK);
    BOUND("inverse (eps cond)", distance(n * n, X, R) / (EPS * na * nx), 2);
    fresh_done();
}

static void test_inv_status(uint64_t *s)
{
    const roln_real bad[3] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY};
    int n, i, b;
    for (n = 1; n <= 6; n++) {
        roln_real *A = zeros(n * n), *X = fresh(n * n), *w = fresh(ROLN_INV_WORK(n));
        CHECK(roln_inv(n, A, X, w) == ROLN_E_ILL_CONDITIONED);
        for (i = 0; i < n; i++) A[i * n + n - 1 - i] = (roln_real)(i + 1); /* needs pivots */
        CHECK(roln_inv(n, A, X, w) == ROLN_OK);
        for (i = 0; i < n; i++) CHECK_NEAR(X[(n - 1 - i) * n + i], 1 / (double)(i + 1), 2 * EPS);
        if (n > 1) { /* the limit: condition 1 / (64 n eps), on a diagonal exactly known */
            for (b = 0; b < 2; b++) {
                memset(A, 0, (size_t)(n * n) * sizeof *A);
                for (i = 0; i < n; i++) A[i * n + i] = 1;
                A[0] = 64 * (roln_real)n * ROLN_EPS * (b ? ROLN_C(0.99) : ROLN_C(1.01));
                CHECK(roln_inv(n, A, X, w) == (b ? ROLN_E_ILL_CONDITIONED : ROLN_OK));
            }
            for (i = 0; i < n; i++) A[i] = A[n + i]; /* two equal rows */
            CHECK(roln_inv(n, A, X, w) == ROLN_E_ILL_CONDITIONED);
        }
        for (i = 0; i < n * n; i++)
            for (b = 0; b < 3; b++) {
                A = normal(n * n, 1, s);
                A[i] = bad[b];
                CHECK(roln_inv(n, A, X, w) == ROLN_E_ILL_CONDITIONED);
                if (pools > 40) fresh_done(), X = fresh(n * n), w = fresh(ROLN_INV_WORK(n));
            }
        fresh_done();
    }
}

/* ---- large symmetric systems ---- */

/* order 3: sums of 128 products, each from 0, added to c one after the other. a and b with strides. */
static roln_real order3(int k, roln_real c, const roln_real *a, int sa, const roln_real *b, int sb)
{
    roln_real s = 0;
    int i;
    for (i = 0; i < k; i++) {
        s += a[i * sa] * b[i * sb];
        if (i % 128 == 127 || i == k - 1) c += s, s = 0;
    }
    return c;
}

/* Both products, with rows from.. to - 1 of C, of A [k][n] and of A^T: to the bit; nothing else is written. */
static void check_sums(int k, int n, int from, int to, uint64_t *s)
{
    const roln_real *A = normal(k * n, 1, s);
    roln_real *S0 = normal(n * (n + 1), 1, s), *At = fresh(k * n), *S, *St;
    const ld bound = 0.5L * ((k < 128 ? k : 128) + k / 128) + 2;
    ld worst = 0, e;
    int i, j, bits = 1, kept = 1;
    for (i = 0; i < n; i++) /* to add even 0 to -0 would show */
        for (j = 0; j <= n; j++)
            if (i < from || i >= to || j > i) S0[i * (n + 1) + j] = -ROLN_C(0.0);
    S = copy(n * (n + 1), S0), St = copy(n * (n + 1), S0);
    for (i = 0; i < k; i++)
        for (j = 0; j < n; j++) At[j * k + i] = A[i * n + j];
    roln_sym_at(k, n, from, to, A, S, room_of(ROLN_SYM_WORK)), CHECK_BELOW(room_used(), room_end);
    roln_sym_bt(n, k, from, to, At, St, room_of(ROLN_SYM_WORK)), CHECK_BELOW(room_used(), room_end);
    CHECK(same(n * (n + 1), S, St));
    for (i = 0; i < n; i++)
        for (j = 0; j <= n; j++) {
            const roln_real c0 = S0[i * (n + 1) + j], c = S[i * (n + 1) + j];
            if (i < from || i >= to || j > i) kept &= same(1, &c, &c0);
            else {
                bits &= c == order3(k, c0, A + i, n, A + j, n);
                e = error_of(k, c, c0, A + i, n, A + j, n), worst = e > worst ? e : worst;
            }
        }
    CHECK(bits);
    CHECK(kept);
    BOUND("order 3 (of its bound)", worst / bound, 1);
    fresh_done();
}

/* Groups of rows, strips and tiles of all kinds; rows together and apart; blocks of 128 rows together and apart; exact scratch. */
static void test_sums(uint64_t *s)
{
    static const int large[][2] = {{300, 70}, {127, 129}, {128, 128}, {129, 127}, {257, 65}, {2, 515}, {5, 300}, {0, 5}};
    roln_real *A, *S, *S2;
    int i, k, n;
    for (n = 1; n <= 40; n++)
        for (k = 1; k <= 40; k += 1 + k / 5) check_sums(k, n, 0, n, s), check_sums(k, n, n / 3, n - n / 4, s);
    for (i = 0; i < 8; i++) {
        k = large[i][0], n = large[i][1];
        check_sums(k, n, 0, n, s), check_sums(k, n, 2, 2, s);
        check_sums(k, n, 7 * n / 10, n, s), check_sums(k, n, 0, 7 * n / 10, s);
    }
    n = 50, k = 384 + 20;
    A = normal(k * n, 1, s), S = zeros(n * (n + 1)), S2 = zeros(n * (n + 1));
    roln_sym_at(k, n, 0, n, A, S, room_of(ROLN_SYM_WORK));
    roln_sym_at(256, n, 0, n, A, S2, room_of(ROLN_SYM_WORK));
    roln_sym_at(k - 256, n, 0, n, A + 256 * n, S2, room_of(ROLN_SYM_WORK));
    CHECK(same(n * (n + 1), S, S2));
    fresh_done();
    n = 600, k = 128;
    A = normal(k * n, 1, s), S = zeros(n * (n + 1));
    roln_sym_at(k, n, 0, n, A, S, room_of(ROLN_SYM_WORK));
    CHECK_ROOM();
    fresh_done();
}

/* Two full groups, beside a column that is of none: the room holds them, and the same bits as from one of them at a time. */
static void test_sums_groups(void)
{
    const int n = 2 * ROLNI_GROUP + 1, k = 128, half = n / 2;
    uint64_t s = 7;
    const roln_real *A = normal(k * n, 1, &s);
    roln_real *S = (roln_real *)calloc((size_t)(2 * n * (n + 1)), sizeof *S), *S2 = S + n * (n + 1);
    roln_sym_at(k, n, 1, n, A, S, room_of(ROLN_SYM_WORK));
    CHECK_ROOM();
    roln_sym_at(k, n, 1, half, A, S2, room_of(ROLN_SYM_WORK)), roln_sym_at(k, n, half, n, A, S2, room_of(ROLN_SYM_WORK));
    CHECK_ROOM();
    CHECK(same(n * (n + 1), S, S2));
    free(S);
    fresh_done();
}

/* A long sum of like signs, where a single sum in float loses k eps / 2 in the mean. */
static void test_long_sum(void)
{
    enum { K = 100000 };
    roln_real *A = fresh(2 * K), S[6] = {0, 0, 0, 0, 0, 0};
    uint64_t s = 3;
    int i;
    for (i = 0; i < 2 * K; i++) A[i] = 1 + roln_uniform(&s);
    roln_sym_bt(2, K, 0, 2, A, S, room_of(ROLN_SYM_WORK));
    BOUND("order 3, 100,000 products (eps)", error_of(K, S[3], 0, A, 1, A + K, 1), 4);
    fresh_done();
}

/* U, C + diag(d) = U^T U: as documented, one number after the other. S [n][n+1]. */
static void slow_chol(int n, const roln_real *d, roln_real *S)
{
    const int next = n + 1;
    roln_real *U = S + 1;
    int i, j;
    for (i = 0; i < n; i++) {
        roln_real inv = 0;
        for (j = i; j < n; j++) {
            roln_real c = S[j * next + i], s = 0;
            int p;
            if (j == i) c += d[i];
            for (p = 0; p < i; p++) {
                s += U[p * next + i] * U[p * next + j];
                if (p % 128 == 127) c -= s, s = 0;
            }
            c -= s;
            if (j == i) inv = 1 / ROLN_SQRT(c);
            U[i * next + j] = j == i ? ROLN_SQRT(c) : c * inv;
        }
    }
}

/* C of rank min(n - 1, 60), and damping: factor, solution; factor again with other damping. */
static void check_system(int n, double damping, uint64_t *s)
{
    const int size = n * (n + 1), k = n > 60 ? 60 : n > 1 ? n - 1 : 1;
    const roln_real *b = normal(n, 1, s);
    roln_real *A = normal(k * n, 1, s), *S = zeros(size), *S2, *d = fresh(n), *x = zeros(n + 16);
    ld worst = 0, rest = 0, e;
    int i, j, kept = 1;
    for (i = 0; i < n; i++)
        for (d[i] = (roln_real)damping * (1 + roln_uniform(s)), j = i; j < n; j++) S[i * (n + 1) + j + 1] = poison();
    roln_sym_at(k, n, 0, n, A, S, room_of(ROLN_SYM_WORK));
    S2 = copy(size, S);
    CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == ROLN_OK);
    CHECK_ROOM();
    slow_chol(n, d, S2);
    CHECK(same(size, S, S2));
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            const roln_real shift = i == j ? -d[i] : 0;
            kept &= S[i * (n + 1) + j] == S2[i * (n + 1) + j];
            e = error_of(j + 1, S[i * (n + 1) + j], shift, S + 1 + i, n + 1, S + 1 + j, n + 1), worst = e > worst ? e : worst;
        }
    CHECK(kept);
    BOUND("large Cholesky: C + d - U^T U (eps sum |U||U|)", worst, 8);
    roln_sym_solve(n, S, b, x);
    for (i = 0; i < n; i++) { /* (C + d) x = b, in units of eps sum |C + d||x| */
        ld r = (ld)d[i] * (ld)x[i] - (ld)b[i], sum = fabsl((ld)d[i] * (ld)x[i]) + fabsl((ld)b[i]);
        for (j = 0; j < n; j++) {
            const ld c = (ld)S[(i > j ? i : j) * (n + 1) + (i > j ? j : i)] * (ld)x[j];
            r += c, sum += fabsl(c);
        }
        e = fabsl(r) / (sum * EPS), rest = e > rest ? e : rest;
    }
    for (i = n; i < n + 16; i++) kept &= x[i] == 0;
    CHECK(kept);
    BOUND("large Cholesky: (C + d) x - b (eps sum |C||x|)", rest, 3);
    for (i = 0; i < n; i++) d[i] *= 4; /* another damping: C is still there, and x may be b */
    CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == ROLN_OK);
    slow_chol(n, d, S2);
    CHECK(same(size, S, S2));
    roln_sym_solve(n, S, b, x);
    memcpy(d, b, (size_t)n * sizeof *d);
    roln_sym_solve(n, S, d, d);
    CHECK(same(n, d, x));
    fresh_done();
}

/* Every place of a small matrix, and places around the blocks of a large one; C remains. */
static void test_system_status(uint64_t *s)
{
    static const int sizes[] = {1, 2, 3, 5, 9, 129, 140}, places[] = {0, 1, 8, 126, 127, 128, 129, 139};
    const roln_real bad[4] = {(roln_real)NAN, (roln_real)INFINITY, -(roln_real)INFINITY, -1};
    int c, n, i, j, b;
    for (c = 0; c < 7; c++) {
        const int size = sizes[c] * (sizes[c] + 1), few = sizes[c] > 9;
        roln_real *d = zeros(sizes[c]), *S = zeros(size), *S2;
        n = sizes[c];
        for (i = 0; i < n; i++) S[i * (n + 2)] = 1 + roln_uniform(s);
        CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == ROLN_OK);
        S2 = copy(size, S);
        for (i = 0; i < n; i++)
            for (j = 0; j <= i; j++)
                for (b = 0; b < 4; b++) {
                    roln_real *at = S + i * (n + 1) + j, *const at_d = d + i, was = *at;
                    int p, q;
                    for (p = 0; p < 8 && places[p] != i; p++) {}
                    for (q = 0; q < 8 && places[q] != j; q++) {}
                    if (few && (p == 8 || q == 8)) continue;
                    *at = b == 3 && j < i ? 3 : bad[b];
                    CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == ROLN_E_NOT_SPD);
                    *at = was;
                    if (i != j) continue;
                    *at_d = b == 3 ? -was : bad[b]; /* exactly semi-definite */
                    CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == ROLN_E_NOT_SPD);
                    *at_d = 0;
                }
        for (i = 0; i < n; i++) CHECK(same(i + 1, S + i * (n + 1), S2 + i * (n + 1)));
        for (i = 0; i < n; i++) /* rank 1, exactly */
            for (j = 0; j <= i; j++) S[i * (n + 1) + j] = 4;
        CHECK(roln_sym_chol(n, d, S, room_of(ROLN_SYM_CHOL_WORK(n))) == (n > 1 ? ROLN_E_NOT_SPD : ROLN_OK));
        fresh_done();
    }
}

/* ---- random numbers, finite ---- */

static void test_random(void)
{
    static const uint64_t known[5] = {UINT64_C(0xe220a8397b1dcdaf), UINT64_C(0x6e789e6aa1b965f4), UINT64_C(0x06c45d188009454f),
                                      UINT64_C(0xf88bb8a8724c81ec), UINT64_C(0x1b39896a51a8749b)};
    enum { count = 1 << 20 };
    uint64_t s = 0, s2;
    double mean = 0, var = 0, kurt = 0, umean = 0, top = 0, low = 1;
    int hits[10] = {0}, inside = 0, i, n;
    for (i = 0; i < 5; i++) CHECK(roln_rand(&s) == known[i]);
    for (i = 0, s = s2 = 7; i < 1000; i++) CHECK((double)roln_uniform(&s) == (double)(roln_rand(&s2) >> 40) / 16777216);
    CHECK(s == s2);
    for (i = 0; i < count; i++) {
        const double u = (double)roln_uniform(&s), x = (double)roln_normal(&s);
        umean += u / count;
        top = u > top ? u : top, low = u < low ? u : low;
        mean += x / count, var += x * x / count, kurt += x * x * x * x / count;
        inside += x >= -6 && x < 6;
        hits[roln_randint(10, &s)]++;
    }
    CHECK(low >= 0 && low < 1e-5 && top < 1 && top > 1 - 1e-5);
    CHECK(inside == count);
    CHECK_NEAR(umean, 0.5, 5 * 0.289 / 1024); /* five standard errors */
    CHECK_NEAR(mean, 0, 5 / 1024.);
    CHECK_NEAR(var, 1, 5 * 1.4 / 1024);
    CHECK_NEAR(kurt, 2.9, 0.06); /* 3 - 6/5 / 12 */
    for (i = 0; i < 10; i++) CHECK_NEAR(hits[i], count / 10, 5 * 308);
    s2 = s;
    for (mean = 0, i = 0; i < 12; i++) mean += (double)(roln_rand(&s2) >> 40) / 16777216;
    CHECK((double)roln_normal(&s) == (double)(roln_real)(mean - 6));
    for (n = 1; n <= 40; n++)
        for (i = 0; i < 200; i++) {
            const int k = roln_randint(n, &s);
            CHECK(k >= 0 && k < n);
        }
    for (i = 0; i < 100; i++) {
        const int k = roln_randint(INT32_MAX, &s);
        CHECK(k >= 0 && k < INT32_MAX);
    }
}

static void test_finite(void)
{
    const roln_bits inf = ROLNI_INF, sign = ROLNI_SIGN, normal = (roln_bits)1 << ROLNI_MANT;
    const roln_bits bits[] = {0, 1, inf / 3, inf - 1, inf, inf + 1, inf | (inf >> 1), sign - 1, normal};
    uint64_t s = 5;
    int i, q;
    for (i = 0; i < 9; i++)
        for (q = 0; q < 2; q++) {
            const roln_bits b = bits[i] | (q ? sign : 0);
            roln_real x[9] = {0};
            memcpy(x + i, &b, sizeof b);
            CHECK(roln_finite(x[i]) == (bits[i] < inf));
            CHECK(roln_all_finite(9, x) == (bits[i] < inf));
            CHECK(roln_all_finite(i, x));
        }
    for (i = 0; i < 100000; i++) {
        const roln_bits b = (roln_bits)roln_rand(&s) | (i % 3 ? 0 : inf);
        roln_real x;
        memcpy(&x, &b, sizeof b);
        CHECK(roln_finite(x) == ((b & ~sign) < inf));
    }
}

/* Strips of a panel are those of the comment at rolni_pack, and nothing behind them is written. */
static void test_strips(void)
{
    enum { W = ROLNI_COLS, K = 13, MOST = 2 * W + 3 };
    static roln_real A[(K + 1) * (MOST + 1) + 8], P[3 * W * K + 8 * W];
    int turned, k, n, i, j, p;
    for (i = 0; i < (int)(sizeof A / sizeof *A); i++) A[i] = (roln_real)(i + 1);
    for (turned = 0; turned < 2; turned++)
        for (k = 1; k <= K; k++)
            for (n = 1; n <= MOST; n++) {
                const int row = (turned ? k : n) + 1, columns = (n + W - 1) / W * W;
                int wrong = 0;
                for (i = 0; i < columns * k + 8 * W; i++) P[i] = -1;
                rolni_pack(k, n, turned, A, (size_t)row, P);
                for (j = 0; j < columns; j++)
                    for (p = 0; p < k; p++)
                        wrong += P[(j / W * k + p) * W + j % W] != (j >= n ? 0 : turned ? A[j * row + p] : A[p * row + j]);
                for (i = 0; i < 8 * W; i++) wrong += P[columns * k + i] != -1;
                CHECK(wrong == 0);
            }
}

void TEST_NAME(dense)(void)
{
    static const int large[][3] = {{33, 64, 35}, {64, 33, 66},  {7, 130, 29}, {100, 100, 100},
                                   {1, 600, 64}, {2, 64, 601}, {5, 0, 9},    {4, 8, 0}};
    static const int systems[] = {63, 70, 127, 128, 129, 200, 255, 257, 384, 515};
    uint64_t seed = 17;
    int i, mm, k, n;
    for (mm = 1; mm <= 20; mm++)
        for (k = 1; k <= 20; k++)
            for (n = 1; n <= 20; n++) check_products(mm, k, n, &seed);
    for (i = 0; i < 8; i++) check_products(large[i][0], large[i][1], large[i][2], &seed);
    test_nan();
    for (n = 1; n <= 24; n++)
        for (i = 0; i < 5; i++) check_spd(n, i % 2 ? 1 : 0.01, &seed), check_inv(n, &seed);
    check_spd(70, 1, &seed);
    test_chol_status(&seed);
    test_inv_status(&seed);
    test_sums(&seed), test_sums_groups();
    test_long_sum();
    for (n = 1; n <= 40; n++)
        for (i = 0; i < 3; i++) check_system(n, i % 2 ? 1 : 0.01, &seed);
    for (i = 0; i < 10; i++) check_system(systems[i], 0.1, &seed);
    test_system_status(&seed);
    test_random();
    test_finite();
    test_strips();
    print_bounds();
}
