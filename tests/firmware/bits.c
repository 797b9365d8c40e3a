/* SPDX-License-Identifier: MIT */
/* bits.c - kernels for the vectors of the Cortex-M55, number by number beside the same kernels in plain C (bits_plain.c): random
   sizes 0 .. 40, every alignment of floats, and three kinds of numbers. Kind 0 is normal. Kind 1 has zeros, denormal numbers and
   numbers whose products are denormal, too, kind 2 also NaN and infinities. NaN may be any NaN, as on other targets. Nothing beside
   the results may change. Then a control loop of the chain, in which denormal positions come in. Ends with 0 if all bits are equal
   and a product of 64 x 64 takes at most one instruction per multiply-add. */
#include "bits.h"
#include "text.h"

#if !ROLNI_MVE
#error "this core has no vectors"
#endif

enum { MOST = 40, ROWS = 7, ROOM = MOST * MOST + 8, CALLS = 400, TICKS = 300 };

static const struct kernels fast = KERNELS;
static uint64_t seed = 1;
static int failed;

/* A number of a kind: 0 normal, 1 and small ones, 2 and not finite ones. */
static roln_real number(int kind)
{
    static const uint32_t small[] = {0, 0x80000000, 1, 0x80000001, 0x007fffff,
                                     0x00800000, 0x80ffffff, 0x1f000000, 0x9e800000};
    static const uint32_t large[] = {0x7f800000, 0xff800000, 0x7fc00000, 0xffc00001,
                                     0x7f7fffff, 0xff7fffff, 0x42ae0000, 0xc2d00000};
    const int which = kind > 0 ? roln_randint(kind > 1 ? 12 : 24, &seed) : 2;
    if (which == 0) return rolni_real(small[roln_randint(9, &seed)]);
    if (which == 1 && kind > 1) return rolni_real(large[roln_randint(8, &seed)]);
    return 4 * roln_normal(&seed);
}

static void fill(int n, int kind, roln_real *x)
{
    while (n-- > 0)
        *x++ = number(kind);
}

static void compare(const char *what, int a, int b, int c, int n, const roln_real *x, const roln_real *y)
{
    for (int i = 0; i < n; i++)
        if (rolni_bits(x[i]) != rolni_bits(y[i]) && !(x[i] != x[i] && y[i] != y[i])) {
            put_text(what), put_integer((uint32_t)a, 4), put_integer((uint32_t)b, 4), put_integer((uint32_t)c, 4);
            put_text(": number"), put_integer((uint32_t)i, 5), put_text(" is "), put_hex(rolni_bits(x[i]), 8);
            put_text(", not "), put_hex(rolni_bits(y[i]), 8), put_text("\n");
            failed++;
            return;
        }
}

static roln_real A[ROOM], B[ROOM], C[2][ROOM], D[2][ROOM];

/* C[0] and D[0] of fast kernels beside C[1] and D[1] of plain ones; both begin as random numbers. */
static void start(int kind)
{
    fill(ROOM, kind, C[0]), fill(ROOM, kind, D[0]);
    memcpy(C[1], C[0], sizeof C[0]), memcpy(D[1], D[0], sizeof D[0]);
}

static void products(int kind)
{
    const int m = roln_randint(ROWS + 1, &seed), k = roln_randint(MOST + 1, &seed), n = roln_randint(MOST + 1, &seed);
    const roln_real *const a = A + roln_randint(4, &seed), *const b = B + roln_randint(4, &seed);
    const int at = roln_randint(4, &seed);
    fill(ROOM, kind, A), fill(ROOM, kind, B);
    start(kind);
    fast.mm(m, k, n, a, b, C[0] + at), plain.mm(m, k, n, a, b, C[1] + at);
    compare("mm", m, k, n, ROOM, C[0], C[1]);
    start(kind);
    fast.mm_at(m, k, n, a, b, C[0] + at), plain.mm_at(m, k, n, a, b, C[1] + at);
    compare("mm_at", m, k, n, ROOM, C[0], C[1]);
    start(kind);
    fast.mm_bt(m, k, n, a, b, C[0] + at), plain.mm_bt(m, k, n, a, b, C[1] + at);
    compare("mm_bt", m, k, n, ROOM, C[0], C[1]);
}

static void elements(int kind)
{
    const int n = roln_randint(MOST + 1, &seed), at = roln_randint(4, &seed);
    const roln_real c = number(kind), s = number(kind), c1 = number(kind), s1 = number(kind);
    start(kind);
    for (int f = 0; f < 2; f++)
        (f ? plain : fast).softplus_n(n, C[f] + at, C[f] + at, D[f] + at);
    compare("softplus", n, 0, 0, ROOM, C[0], C[1]), compare("sigmoid", n, 0, 0, ROOM, D[0], D[1]);
    start(kind);
    for (int f = 0; f < 2; f++) {
        (f ? plain : fast).rotate(n, c, s, C[f] + at);
        (f ? plain : fast).rotate2(n, c1, s1, c, s, D[f] + at);
    }
    compare("rotate", n, 0, 0, ROOM, C[0], C[1]), compare("rotate2", n, 0, 0, ROOM, D[0], D[1]);
    if (fast.all_finite(n, C[0]) != plain.all_finite(n, C[0])) put_text("all_finite\n"), failed++;
}

static void network(int kind)
{
    const int in = 1 + roln_randint(6, &seed), wide = 1 + roln_randint(16, &seed), out = 1 + roln_randint(10, &seed);
    const int planes = 1 + roln_randint(4, &seed);
    const roln_mlp f = {3, {in, wide, wide, out}, 0};
    static roln_real slope[2][2 * 16];
    fill(ROOM, kind, A), fill(ROOM, kind, B);
    start(kind);
    for (int k = 0; k < 2; k++)
        (k ? plain : fast).mlp(&f, 1, planes, 1, A, B, C[k], slope[k], D[k]);
    compare("network", in, wide, out, ROOM, C[0], C[1]), compare("hidden", in, wide, out, ROOM, D[0], D[1]);
    compare("slope", in, wide, out, 2 * wide, slope[0], slope[1]);
    start(kind);
    for (int k = 0; k < 2; k++)
        (k ? plain : fast).mlp_gradient(&f, planes, 1, A, slope[1], B, C[k], D[k], NULL);
    compare("gradient", in, wide, out, ROOM, C[0], C[1]), compare("input", in, wide, out, ROOM, D[0], D[1]);
}

/* Both loops see the same; every fifth measured position or velocity is denormal. */
static void loop(void)
{
    static const roln_limits limits = {.dt = 0.001f, .margin = 0.1f, .residual = 1e9f, .tau = 1e9f, .hold = 5,
                                       .q_tolerance = 1e9f, .qd_tolerance = 1e9f};
    static chain_target ref;
    static chain_latent s[2], seen[2];
    static chain_guard guard[2];
    static chain_state x[2];
    static chain_work work;
    for (int i = 0; i < chain_n; i++)
        ref.z[i] = 0.3f * roln_normal(&seed), ref.kp[i] = 100, ref.kd[i] = 10;
    for (int t = 0; t < TICKS; t++) {
        for (int f = 0; f < 2; f++) {
            const struct kernels *const k = f ? &plain : &fast;
            uint64_t same = (uint64_t)t;
            if (k->decode(&chain_weights, &s[f], &x[f], &work.decode) != ROLN_OK) failed++;
            if (t % 5 == 4) x[f].q[roln_randint(chain_N, &same)] = x[f].qd[roln_randint(chain_N, &same)] = rolni_real(0x00012345);
            if (k->tick(&chain_weights, &limits, &x[f], &ref, &seen[f], &guard[f], &work.tick) != 0) failed++;
            if (k->step(&chain_weights, &s[f], guard[f].tau, limits.dt, &work.step) != ROLN_OK) failed++;
        }
        compare("positions", t, 0, 0, chain_N, x[0].q, x[1].q), compare("velocities", t, 0, 0, chain_N, x[0].qd, x[1].qd);
        compare("torques", t, 0, 0, chain_N, guard[0].tau, guard[1].tau), compare("state", t, 0, 0, chain_n, s[0].z, s[1].z);
    }
}

/* Instructions of a product of 64 x 64, more than 64 * 64 fail. */
static void cost(const struct kernels *k, int limit)
{
    static roln_real matrix[64 * 64], x[64], y[64];
    fill(64 * 64, 0, matrix), fill(64, 0, x);
    (void)board_count();
    const uint32_t before = board_count();
    k->mm(1, 64, 64, x, matrix, y);
    const uint32_t mm = board_count() - before;
    k->mm_bt(1, 64, 64, x, matrix, y);
    put_text("instructions"), put_integer(mm, 6), put_integer(board_count() - before - mm, 6), put_text("\n");
    if (limit && mm > 64 * 64) failed++;
}

/* Numbers that are written one by one, and then read as vectors: no load comes before its store. What is there before is NaN. */
__attribute__((noinline)) static void forget(void)
{
    volatile uint32_t stack[64];
    for (int i = 0; i < 64; i++)
        stack[i] = 0x7fc00000, (void)stack[i];
}

__attribute__((noinline)) static int listed(const roln_real *x, roln_real a)
{
    const roln_real list[8] = {a, x[0] * a, x[1] * a, x[2] * a, 1, x[3], x[4] + a, 2};
    return roln_all_finite(8, list);
}

static void order(void)
{
    for (int i = 0; i < 4; i++) {
        forget();
        if (!listed(B + i, 1)) put_text("numbers are read before they are written\n"), failed++;
    }
}

int main(void)
{
    for (int kind = 0; kind < 3; kind++)
        for (int i = 0; i < CALLS; i++)
            products(kind), elements(kind), network(kind);
    fill(9, 0, B), order();
    loop();
    cost(&fast, 1), cost(&plain, 0);
    put_integer((uint32_t)failed, 0), put_text(" failed\n");
    return failed != 0;
}
