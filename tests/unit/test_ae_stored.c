/* SPDX-License-Identifier: MIT */
/* Weights of an autoencoder that are stored small, as halves or bytes (roln_ae.h, section 8; float alone): products and maps
   against twins of what is stored, the left inverse that the stored pairs have, what cannot be stored. */
#include "roln_ae.h"
#include "autoencoder.h"

void TEST_NAME(ae_stored)(void);

#ifndef ROLN_DOUBLE
/* Entry j of a row as the header defines it. */
static ld t_entry(int bits, const float *row, int j)
{
    uint32_t w;
    memcpy(&w, row + (bits == 8) + j * bits / 32, sizeof w);
    w = w >> j * bits % 32 & (bits == 8 ? 255 : 65535);
    if (bits == 8) return (ld)row[0] * ((ld)w - (w > 127 ? 256 : 0));
    return (w & 0x8000 ? -1 : 1) * ldexpl((ld)(w & 1023) + (w & 0x7c00 ? 1024 : 0), (int)(w & 0x7c00 ? w >> 10 & 31 : 1) - 25);
}

/* Rows [rows][n], stored, as numbers. */
static void t_unpack(int bits, int rows, int n, const float *from, ld *to)
{
    int i, j;
    for (i = 0; i < rows; i++)
        for (j = 0; j < n; j++) to[i * n + j] = t_entry(bits, from + i * ROLN_AE_ROW(bits, n), j);
}

/* What is stored against what was to be stored, and the three products against sums of what is stored. */
static void check_products(const roln_storage *storage, int rows, int k, int n, uint64_t *s)
{
    static ld B[40 * 40];
    const int bits = storage->bits, row = ROLN_AE_ROW(bits, n);
    float *b = normal(k * n, 0.5, s), *st = fresh(k * row), *a, *c, *one, *j1;
    int i, j, p;
    for (i = 0; i < k * n; i++) b[i] *= i % 7 == 0 ? 1e-3f : 1; /* of different size */
    CHECK(rolni_quantise_matrix(bits, k, n, b, st) == ROLN_OK);
    t_unpack(bits, k, n, st, B);
    for (i = 0; i < k; i++)
        for (j = 0; j < row * 32 / bits - (bits == 8 ? 4 : 0); j++) {
            const ld w = j < n ? (ld)b[i * n + j] : 0, e = fabsl(t_entry(bits, st + i * row, j) - w);
            BOUND(bits == 8 ? "stored int8: rounding (s)" : "stored half: rounding (2^-11 w + 2^-25)",
                  bits == 8 ? e / (ld)st[i * row] : e / (ldexpl(fabsl(w), -11) + ldexpl(1, -25)), bits == 8 ? 0.50001L : 1);
        }
    a = normal(rows * k, 1, s), c = fresh(rows * n), one = fresh(n);
    storage->mm(rows, k, n, a, st, c); /* rows x k times k x n */
    for (i = 0; i < rows; i++) {
        storage->mm(1, k, n, a + i * k, st, one);
        CHECK(same(n, one, c + i * n));
        for (j = 0; j < n; j++) {
            ld sum = 0, size = 0;
            const float got = storage->column(k, n, j, a + i * k, st);
            for (p = 0; p < k; p++) sum += (ld)a[i * k + p] * B[p * n + j], size += fabsl((ld)a[i * k + p] * B[p * n + j]);
            BOUND("stored: mm (eps of terms)", fabsl((ld)c[i * n + j] - sum) / ((size + 1e-20L) * EPS), 4 + k / 4);
            CHECK(same(1, &got, c + i * n + j));
        }
    }
    a = normal(rows * n, 1, s), c = fresh(rows * k), j1 = fresh(k);
    storage->mm_bt(rows, n, k, a, st, c); /* rows x n times n x k */
    for (i = 0; i < rows; i++) {
        storage->mm_bt(1, n, k, a + i * n, st, j1);
        CHECK(same(k, j1, c + i * k));
        for (j = 0; j < k; j++) {
            ld sum = 0, size = 0;
            for (p = 0; p < n; p++) sum += (ld)a[i * n + p] * B[j * n + p], size += fabsl((ld)a[i * n + p] * B[j * n + p]);
            BOUND("stored: mm_bt (eps of terms)", fabsl((ld)c[i * k + j] - sum) / ((size + 1e-20L) * EPS), 6);
        }
    }
    fresh_done();
}

/* The half nearest to |x| < 65520 by its definition: multiples of 2^(e-10), 2^e <= |x|, e = -14 below 2^-14; half-way to even. */
static uint32_t t_half(float x)
{
    int e;
    ld r, k;
    frexpl(fabsl((ld)x), &e), e = e - 1 < -14 ? -14 : e - 1;
    r = ldexpl(fabsl((ld)x), 10 - e), k = floorl(r);
    k += r - k > 0.5L || (r - k >= 0.5L && fmodl(k, 2) > 0);
    /* the leading one counts as exponent, carries too */
    return (signbit(x) ? 0x8000 : 0) + (uint32_t)k + (uint32_t)(e + 14) * 1024;
}

static void check_half(float x)
{
    CHECK(rolni_to_half(x) == t_half(x) && rolni_to_half(-x) == t_half(-x));
}

/* All halves there and back; ties go to even, what is too large is seen. Floats against the definition: a stride of all,
   and those around every tie below 2^-13. */
static void test_halves(void)
{
    uint32_t h, b;
    for (b = 1; b < UINT32_C(0x477ff000); b += b < UINT32_C(0x33000000) ? 65521 : b < UINT32_C(0x39000000) ? 61 : 4093)
        check_half(rolni_real(b));
    for (h = 0; h < 0x800; h++) { /* half-way behind h, and three floats on either side */
        const uint32_t tie = rolni_bits((float)ldexpl((ld)(h < 1024 ? h : h % 1024 + 1024) + 0.5L, -24));
        for (b = tie - 3; b <= tie + 3; b++) check_half(rolni_real(b));
    }
    for (h = 0; h < 0x7c00; h++) {
        float row[4] = {0, 0, 0, 0}, x, one = 1, y[2];
        const uint32_t both = h | (h | 0x8000) << 16;
        memcpy(row, &both, sizeof both);
        x = (float)t_entry(16, row, 0);
        roln_half_mm(1, 1, 2, &one, row, y);
        CHECK(y[0] == x && y[1] == -x);
        CHECK(rolni_to_half(x) == h && rolni_to_half(-x) == (h | 0x8000));
        if (h > 0) CHECK(rolni_to_half((x + (float)t_entry(16, row, 1) * (1 - 1 / 1024.f)) / 2 + x) >= h);
        if (h % 2 == 0 && h + 1 < 0x7c00) {
            float next[4] = {0, 0, 0, 0};
            const uint32_t up = h + 1;
            memcpy(next, &up, sizeof up);
            CHECK(rolni_to_half((x + (float)t_entry(16, next, 0)) / 2) == h); /* half-way */
        }
    }
    CHECK(rolni_to_half(65519.996f) == 0x7bff && rolni_to_half(65520) >= 0x7c00 && rolni_to_half(3e38f) >= 0x7c00);
}

/* Largest |(I + D) Psi^T Phi - I|_F of a layer of stored weights. */
static ld t_off(const roln_ae *ae, const float *th)
{
    static ld phi[MAXW * MAXW], psi[MAXW * MAXW], D[MAXW * MAXW], A[MAXW * MAXW];
    const int bits = ae->storage->bits;
    ld worst = 0;
    int l, i, j, k;
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], row = ROLN_AE_ROW(bits, N);
        ld off = 0;
        t_unpack(bits, n, N, th, phi), t_unpack(bits, n, N, th + n * row, psi), t_unpack(bits, n, n, th + 2 * n * row, D);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                for (A[i * n + j] = 0, k = 0; k < N; k++) A[i * n + j] += psi[i * N + k] * phi[j * N + k];
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++) {
                ld e = A[i * n + j] - (i == j);
                for (k = 0; k < n; k++) e += D[i * n + k] * A[k * n + j];
                off += e * e;
            }
        if (off > worst) worst = off;
        th += ROLN_AE_LAYER(bits, N, n);
    }
    return sqrtl(worst);
}

/* What roln_ae_check says of stored weights is what long double finds, with Phi scaled to either side of the bound, with D
   forgotten, with two rows of Psi exchanged. */
static void check_stored_off(const roln_ae *ae, const float *theta)
{
    const int bits = ae->storage->bits, size = roln_ae_params(ae);
    int l, change, at = 0, refused = 0;
    CHECK(t_off(ae, theta) < 0.01L && roln_ae_check(ae, theta) == ROLN_OK);
    for (l = 0; l < ae->layers; l++) {
        const int N = ae->size[l], n = ae->size[l + 1], row = ROLN_AE_ROW(bits, N);
        for (change = 0; change < 5; change++) {
            float *th = copy(size, theta), *phi = th + at, *psi = phi + n * row, *last = phi + (n - 1) * row;
            ld off;
            if (change < 3 && bits == 8) *last *= change == 0 ? 1.005f : change == 1 ? 0.98f : 1.02f;
            if (change == 3) memset(psi + n * row, 0, (size_t)(n * ROLN_AE_ROW(bits, n)) * sizeof *th);
            if (change == 4) memcpy(psi, theta + at + n * row + (n - 1) * row, (size_t)row * sizeof *th);
            off = t_off(ae, th);
            if (fabsl(off / (ld)ROLN_AE_OFF - 1) < 1e-3L) continue; /* on the bound */
            CHECK(roln_ae_check(ae, th) == (off > (ld)ROLN_AE_OFF ? ROLN_E_ILL_CONDITIONED : ROLN_OK));
            refused += off > (ld)ROLN_AE_OFF;
        }
        at += ROLN_AE_LAYER(bits, N, n);
    }
    CHECK(refused > 0 || bits == 16);
}

/* The twin's weights are those that st stores, Psi = (I + D) Psi_q. */
static void t_stored(const roln_ae *ae, const float *st)
{
    static ld phi[MAXW * MAXW], psi[MAXW * MAXW], D[MAXW * MAXW];
    const int bits = ae->storage->bits;
    int l, i, j, p, at = 0, numbers = 0;
    for (l = 0, p = 0; l < ae->layers; l++) {
        const int a = ae->size[l], b = ae->size[l + 1], row = ROLN_AE_ROW(bits, a);
        t_unpack(bits, b, a, st + at, phi), t_unpack(bits, b, a, st + at + b * row, psi);
        t_unpack(bits, b, b, st + at + 2 * b * row, D);
        for (i = 0; i < a * b; i++) {
            ld sum = psi[i];
            for (j = 0; j < b; j++) sum += D[i / a * b + j] * psi[j * a + i % a];
            m.th[p + i] = phi[i], m.th[p + a * b + i] = sum;
        }
        at += 2 * b * row + b * ROLN_AE_ROW(bits, b);
        for (i = 0; i < a; i++) m.th[p + 2 * a * b + i] = (ld)st[at + i];
        at += a, p += 2 * a * b + a, numbers += a + (bits == 8 ? 3 * b : 0);
    }
    if (ae->monomials > 0) {
        const int N = ae->size[ae->layers - 1];
        t_unpack(bits, ae->monomials, N, st + at, m.th + p);
        at += ae->monomials * ROLN_AE_ROW(bits, N), p += ae->monomials * N, numbers += bits == 8 ? ae->monomials : 0;
    }
    CHECK(at == roln_ae_params(ae) && p <= MAXP);
    for (i = 0; i < at; i++) numbers -= roln_ae_is_number(ae, i) != 0;
    CHECK(numbers == 0 && roln_ae_is_number(ae, -1) && roln_ae_is_number(ae, at));
}

/* The map of m.enc with m.jets at m.nb samples is the twin, backward and with forces too. */
static void check_stored_map(const roln_ae *ae, const float *st, uint64_t *s)
{
    static ld ref[MAXB * MAXW];
    const int nb = m.nb, ni = m.jets * nb * dim_in(), no = m.jets * nb * dim_out();
    float *in = normal(ni, AMP(*ae), s), *x = fresh(no), *g = normal(no, 1, s), *gin = zeros(ni), *tau, *y, *f, *gtau;
    float *tape = fresh(tape_size(m.enc, m.jets, nb)), *w = fresh(bwd_size(m.enc, m.jets, nb));
    ld off;
    int i, j;
    widen(ni, in, m.in), widen(no, g, m.g);
    run(nb, st, in, x, tape);
    t_jets(m.in, ref);
    for (i = 0, j = nb * dim_out(); i < m.jets; i++)
        BOUND("stored: forward (eps)", distance(j, x + i * j, ref + i * j) / EPS, 60);
    run_bwd(st, tape, g, gin, NULL, w);
    BOUND("stored: gradient of the input (eps)", t_gradient(ni, gin, m.in, 2e-4L, t_loss, NULL) / EPS, 60 + NOISE);
    if (m.jets > 1) return;
    tau = normal(no, 1, s), y = normal(ni, 1, s), f = fresh(ni);
    widen(no, tau, m.tau);
    run_force(st, in, tau, f);
    t_force(ref);
    BOUND("stored: force maps (eps)", distance(ni, f, ref) / EPS, 40);
    if (m.enc) return;
    gin = zeros(ni), gtau = zeros(no), w = fresh(ROLN_AE_REDUCE_BWD_WORK(OF_M, nb));
    widen(ni, y, m.g);
    roln_ae_reduce_bwd(ae, nb, st, in, tau, y, gin, gtau, NULL, w);
    off = t_gradient(ni, gin, m.in, 2e-4L, t_force_loss, NULL) / EPS;
    BOUND("stored: reduce: gradient of the point (eps)", off, 100 + 2 * NOISE);
    off = t_gradient(no, gtau, m.tau, 2e-4L, t_force_loss, NULL) / EPS;
    BOUND("stored: reduce: gradient of the force (eps)", off, 40 + NOISE);
    check_reduce_jac(*ae, st, 100, s);
    m.nb = nb;
}

/* Nearly the left inverse, of points and of forces. */
static void check_stored_inverse(const roln_ae *ae, const float *st, uint64_t *s)
{
    enum { nb = 3 };
    static ld ref[MAXB * MAXW];
    const int N = ae->size[0], n = ae->size[ae->layers], bits = ae->storage->bits;
    float *z = normal(3 * nb * n, AMP(*ae), s), *x = fresh(3 * nb * N), *zz = fresh(3 * nb * n), *tape, *tau, *f, *back, *w;
    int i;
    roln_ae_decode(ae, 3, nb, st, z, x, fresh(tape_size(0, 3, nb)));
    roln_ae_encode(ae, 3, nb, st, x, zz, fresh(tape_size(1, 3, nb)));
    widen(3 * nb * n, z, ref);
    for (i = 0; i < 3; i++)
        BOUND(bits == 8 ? "stored int8: rho(phi(z)) = z" : "stored half: rho(phi(z)) = z",
              distance(nb * n, zz + i * nb * n, ref + i * nb * n), bits == 8 ? 3e-3L : 1e-5L);
    tape = fresh(tape_size(0, 1, nb)), w = fresh(ROLN_AE_LIFT_WORK(OF_M, nb));
    tau = fresh(nb * N), back = fresh(nb * n), f = fresh(ROLN_AE_LIFT_TAPE(OF_M, nb));
    roln_ae_decode(ae, 1, nb, st, z, NULL, tape);
    roln_ae_lift_tape(ae, 1, nb, tape, f);
    roln_ae_lift(ae, nb, st, f, z + nb * n, tau, w);
    roln_ae_reduce(ae, nb, st, tape, tau, back, fresh(ROLN_AE_REDUCE_WORK(OF_M, nb)));
    BOUND(bits == 8 ? "stored int8: reduce(lift(tau_z))" : "stored half: reduce(lift(tau_z))",
          distance(nb * n, back, ref + nb * n), bits == 8 ? 1e-3L : 1e-5L);
}

/* A stored autoencoder is the twin with the weights that it stores, in every jet; and nearly the left inverse. */
static void check_stored(roln_ae ae, const roln_storage *storage, uint64_t *s)
{
    const int n = ae.size[ae.layers];
    float *th, *st, *w, *lo = fresh(n), *hi = fresh(n);
    int i;
    m.ae = ae;
    th = weights(s);
    for (i = 0; i < n; i++) lo[i] = -1.5f, hi[i] = 1.5f;
    m.ae.storage = ae.storage = storage;
    st = fresh(roln_ae_params(&ae));
    w = fresh(ROLN_AE_QUANTISE_WORK(OF_M));
    CHECK(roln_ae_quantise(&ae, th, lo, hi, st, w) == ROLN_OK);
    t_stored(&ae, st);
    m.nb = 3;
    for (m.enc = 0; m.enc < 2; m.enc++)
        for (m.jets = 1; m.jets <= 3; m.jets++) check_stored_map(&ae, st, s);
    check_stored_inverse(&ae, st, s);
    fresh_done();
    st = copy(roln_ae_params(&ae), st);
    check_stored_off(&ae, st);
    fresh_done();
}

/* What can not be stored is refused, and theta stays as it was. */
static void test_refused(const roln_storage *storage, uint64_t *s)
{
    roln_ae ae = {.layers = 2, .size = {6, 4, 2}, .slope = SLOPE, STRAIGHT};
    const int params = roln_ae_params(&ae);
    static const float bad[3] = {INFINITY, -INFINITY, NAN};
    float z[4] = {-1, -1, 1, 1}, *th, *st, *was, *w;
    int i, j, size;
    m.ae = ae, th = weights(s);
    ae.storage = storage, size = roln_ae_params(&ae);
    st = normal(size, 1, s), was = copy(size, st), m.ae = ae, w = fresh(ROLN_AE_QUANTISE_WORK(OF_M));
#define STORE() roln_ae_quantise(&ae, th, z, z + 2, st, w)
    for (j = 0; j < 3; j++) {
        for (i = 0; i < params; i++) {
            const float x = th[i];
            th[i] = bad[j];
            CHECK(STORE() == ROLN_E_NOT_FINITE);
            th[i] = x;
        }
        for (i = 0; i < 4; i++) {
            const float x = z[i];
            z[i] = bad[j];
            CHECK(STORE() == ROLN_E_NOT_FINITE);
            z[i] = x;
        }
    }
    for (i = 0; i < 2; i++) { /* no range, as before NAME_fit_range; an empty one; one upside down */
        static const float range[4][2] = {{0, 0}, {1, 1}, {1, -1}, {3e38f, -3e38f}};
        for (j = 0; j < 4; j++) {
            z[i] = range[j][0], z[2 + i] = range[j][1];
            CHECK(STORE() == ROLN_E_RANGE);
        }
        z[i] = -3e38f, z[2 + i] = 3e38f; /* beyond what float can span */
        CHECK(STORE() == ROLN_E_NOT_FINITE);
        z[i] = -1, z[2 + i] = 1;
    }
    for (j = 0; j < 3; j++) { /* rows of zeros, of denormals; of the largest numbers */
        float row[6];
        const roln_status want = j < 2 ? ROLN_E_ILL_CONDITIONED : storage->bits == 16 ? ROLN_E_RANGE : ROLN_E_ILL_CONDITIONED;
        for (i = 0; i < 8; i++) { /* Phi, Psi */
            memcpy(row, th + 6 * i, sizeof row);
            th[6 * i] = j == 0 ? 0 : j == 1 ? 1e-40f : 3e38f, th[6 * i + 1] = th[6 * i + 2] = th[6 * i + 3] = 0;
            th[6 * i + 4] = th[6 * i + 5] = j == 2 ? 1e38f : 0;
            if (i >= 4) CHECK(STORE() == want);
            else CHECK(j < 2 || STORE() != ROLN_OK);
            memcpy(th + 6 * i, row, sizeof row);
        }
    }
    { /* no start for training */
        float *scratch = fresh(ROLN_AE_POD_WORK(OF_M) + ROLN_AE_INIT_WORK(OF_M));
        uint64_t seed = 5;
        CHECK(roln_ae_init(&ae, st, &seed, scratch) == ROLN_E_SHAPE && seed == 5);
        CHECK(roln_ae_init_pod(&ae, 10, th, 1, NULL, st, area, scratch) == ROLN_E_SHAPE);
    }
    ae.storage = ROLN_FULL, m.ae = ae; /* weights that are not to be stored in fewer bits */
    CHECK(roln_ae_quantise(&ae, th, z, z + 2, st, fresh(ROLN_AE_QUANTISE_WORK(OF_M))) == ROLN_E_SHAPE);
    ae.storage = storage, m.ae = ae;
    CHECK(same(size, st, was));
    CHECK(STORE() == ROLN_OK && !same(size, st, was));
    fresh_done();
}

/* The left inverse as rows of Psi come closer to each other: good or refused, never bad. With rows apart, and with halves, none is
   refused; of rows that int8 can hardly tell apart most are. Slope 1: no activation between u and z. */
static void test_parallel(const roln_storage *storage)
{
    enum { N = 16, n = 4, TRIES = 20 };
    static const float lo[n] = {-1, -1, -1, -1}, hi[n] = {1, 1, 1, 1};
    uint64_t s = 5;
    int power, try, i, j, k, refused;
    for (power = 0; power <= 10; power += 2) {
        for (try = refused = 0; try < TRIES; try++) {
            roln_ae ae = {.layers = 1, .size = {N, n}, .slope = 1, STRAIGHT};
            float *th, *psi, *st, *w, x[N], z[n], y[n], tape[N + n];
            ld A[n * n], B[n * N], off, size;
            roln_status code;
            m.ae = ae, th = weights(&s), psi = th + n * N;
            for (i = N; i < n * N; i++) psi[i] = psi[i % N] + ldexpf(psi[i], -power); /* psi_i = psi_0 + .. / 2^power */
            widen(n * N, psi, B);
            for (i = 0; i < n * n; i++)
                for (A[i] = 0, j = 0; j < N; j++) A[i] += B[i / n * N + j] * B[i % n * N + j];
            t_solve(n, N, A, B); /* Phi^T = (Psi^T Psi)^-1 Psi^T */
            for (i = 0; i < n * N; i++) th[i] = (float)B[i];
            ae.storage = storage, m.ae = ae, st = fresh(roln_ae_params(&ae)), w = fresh(ROLN_AE_QUANTISE_WORK(OF_M));
            code = roln_ae_quantise(&ae, th, lo, hi, st, w);
            CHECK(code == ROLN_OK || code == ROLN_E_ILL_CONDITIONED);
            CHECK(code != ROLN_OK || roln_ae_check(&ae, st) == ROLN_OK);
            refused += code != ROLN_OK;
            for (k = 0; k < 50 && code == ROLN_OK; k++) {
                for (i = 0; i < n; i++) z[i] = 2 * roln_uniform(&s) - 1;
                roln_ae_decode(&ae, 1, 1, st, z, x, tape);
                roln_ae_encode(&ae, 1, 1, st, x, y, tape);
                for (i = 0, off = size = 0; i < n; i++) {
                    const ld d = (ld)y[i] - (ld)z[i];
                    off += d * d, size += (ld)z[i] * (ld)z[i];
                }
                if (storage->bits == 8) BOUND("parallel rows int8: |rho(phi(z)) - z| / |z|", sqrtl(off / size), 0.0101L);
                else BOUND("parallel rows half: |rho(phi(z)) - z| / |z|", sqrtl(off / size), 0.0101L);
            }
            fresh_done();
        }
        CHECK(power <= 4 || storage->bits == 16 ? refused == 0 : power < 10 || refused > TRIES / 2);
    }
}

static void test_stored(uint64_t *s)
{
    static const roln_storage *const storages[2] = {&roln_half, &roln_int8};
    int t, rows, k, n, i;
    test_halves();
    for (t = 0; t < 2; t++) {
        for (rows = 1; rows <= 5; rows++)
            for (k = 1; k <= 19; k += 1 + k / 9)
                for (n = 1; n <= 35; n += 1 + n / 9) check_products(storages[t], rows, k, n, s);
        for (i = 0; i < SHAPES; i++)
            if (shapes[i].layers > 0) check_stored(shapes[i], storages[t], s);
        test_refused(storages[t], s);
        test_parallel(storages[t]);
    }
    for (t = 0; t < 2; t++)
        for (i = 0; i < SHAPES; i++)
            for (rows = 1; rows <= 5; rows += 4) {
                roln_ae ae = shapes[i];
                ae.storage = storages[t];
                check_rooms(ae, 2, rows, s);
            }
}

/* The same for autoencoders whose last layer is bent. */

static void test_bent(void)
{
    uint64_t seed = 40;
    int i, small, jets;
    for (i = 0; i < BENT_SHAPES; i++)
        for (small = 0; small < 2; small++) {
            roln_ae ae = bent[i];
            check_stored(ae, small ? &roln_int8 : &roln_half, &seed);
            ae.storage = small ? &roln_int8 : &roln_half;
            for (jets = 1; jets <= 3; jets++) check_rooms(ae, jets, 1 + 4 * small, &seed);
        }
}
#endif

void TEST_NAME(ae_stored)(void)
{
#ifndef ROLN_DOUBLE
    uint64_t seed = 3;
    test_stored(&seed);
    test_bent();
#endif
    print_bounds();
}
