/* SPDX-License-Identifier: MIT */
/* Parameters as bytes and as text (roln_pack, roln_unpack, roln_write, NAME_quantise): every byte corrupted, every length, numbers
   that make no sense under a true checksum; text that a compiler reads as the same numbers, and what it demands of a config;
   weights that are stored small. */
#include <stdlib.h>
#define CALLED(X)
#include "small.h"

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

void TEST_NAME(pack)(void);

/* ---- packed parameters ------------------------------------------------------------------------ */

enum { MAXB = 16000, MAXNUM = MAXP + 64 };

static void random_bits(int n, uint64_t *s, roln_real *x)
{
    while (n > 0) {
        const uint64_t r = roln_rand(s);
        memcpy(x, &r, sizeof *x);
        if (roln_finite(*x)) x++, n--;
    }
}

/* Packed parameters of a model, and where their parts are. */
typedef struct {
    const roln_model *md;
    int n, own, sizes, lead, total, numbers; /* own units; sizes in the head; bytes before slope; all bytes; of NAME_params */
    roln_real x[MAXNUM], to[MAXNUM];    /* packed; where they are unpacked to */
    unsigned char bytes[MAXB], bad[MAXB];
} package;

static void package_of(const roln_model *md, package *p)
{
    const roln_lnn *f = &md->lnn;
    p->md = md, p->n = f->n, p->own = md->own ? md->ae.size[0] : 0;
    p->sizes = 8 + md->ae.layers + f->mass_net.layers + 2 * f->layers + (f->angles ? 2 : 0) + (f->driven > 0) +
               (f->mass_net.degree > 0 ? 2 : 0) + (f->squares > 0);
    p->lead = 8 + 2 * p->sizes;
    p->numbers = 6 + p->own + 3 * f->n + roln_params(md);
    p->total = p->lead + (int)sizeof *p->x * p->numbers + 8;
    CHECK(p->total <= MAXB - 8 && p->numbers <= MAXNUM);
}

/* Packs x; bad is the same, to is full of 7. */
static void seal(package *p)
{
    memset(p->bytes, 0xa5, sizeof p->bytes);
    roln_pack(p->md, p->x, p->bytes);
    CHECK(p->bytes[p->total] == 0xa5);
    memcpy(p->bad, p->bytes, sizeof p->bad);
    fill(MAXNUM, 7, p->to);
}

/* Unpacks bad; unless ROLN_OK nothing may be written. */
static roln_status unpack(package *p, int count)
{
    const roln_status st = roln_unpack(p->md, count, p->bad, p->to);
    CHECK(st == ROLN_OK || all(MAXNUM, p->to, 7));
    return st;
}

/* The same with number i of bad set to y, under a true checksum. */
static roln_status unpack_with(package *p, int i, roln_real y)
{
    const int at = p->lead + i * (int)sizeof y;
    unsigned char *sum = p->bad + p->total - 8;
    roln_status st;
    memcpy(p->bad + at, &y, sizeof y);
    rolni_put(&sum, roln_fnv(p->total - 8, p->bad, ROLN_FNV), 8);
    st = unpack(p, p->total);
    memcpy(p->bad, p->bytes, sizeof p->bad);
    return st;
}

/* Every byte corrupted: in the leading bytes and behind `edge` of them in every way, elsewhere in a way or two and now and then. */
static void check_corruption(package *p, int edge, int all_of)
{
    int i, j;
    for (i = 0; i < p->total; i++)
        for (j = 1; j < 256; j++) {
            const int here = i < p->lead + edge || (edge > 0 && i >= p->total - 9) || i % all_of == 0;
            roln_status want = ROLN_E_CHECKSUM;
            if (i < p->lead) want = ROLN_E_SHAPE;
            if (i == 6) want = ROLN_E_PRECISION;
            if (i < 6) want = ROLN_E_FORMAT;
            if (!here && j != 1 << (i % 8) && (edge <= 0 || j != 255)) continue;
            p->bad[i] ^= (unsigned char)j;
            CHECK(unpack(p, p->total) == want);
            p->bad[i] = p->bytes[i];
        }
}

/* The format that a model must have. */
static int format_of(const roln_model *md)
{
    const roln_lnn *f = &md->lnn;
    return f->mass_net.degree > 0 || f->squares > 0 ? 5 : md->actuator > 0 || f->driven > 0 ? 4 : 3;
}

/* The sizes in the head, in this order, 16 bits each; slope and least lead the numbers. */
static void check_head(const package *p, int bits)
{
    const roln_model *md = p->md;
    const roln_lnn *f = &md->lnn;
    int want[64], c = 0, i;
    CHECK(memcmp(p->bytes, "ROLN", 4) == 0 && p->bytes[4] == format_of(md) && p->bytes[5] == 0);
    CHECK(p->bytes[6] == sizeof(roln_real) && p->bytes[7] == p->sizes);
    want[c++] = md->scheme, want[c++] = md->inputs;
    want[c++] = f->mass + 2 * f->base + 4 * f->damping + 8 * bits + 256 * md->ae.degree + 8192 * md->own +
                (f->friction == 1 ? 4096 : f->friction == 2 ? 16384 : 0) + (f->mass_net.degree > 0 ? 32768 : 0);
    want[c++] = md->ae.layers, want[c++] = f->mass_net.layers, want[c++] = f->layers, want[c++] = f->n;
    for (i = 0; i <= md->ae.layers; i++)
        want[c++] = md->ae.size[i];
    for (i = 1; i < f->mass_net.layers; i++)
        want[c++] = f->mass_net.size[i];
    for (i = 0; i <= f->layers; i++)
        want[c++] = f->n;
    for (i = 0; i < f->layers; i++)
        want[c++] = ROLN_GYRO;
    if (f->angles) want[c++] = (int)(f->angles & 65535), want[c++] = (int)(f->angles >> 16);
    if (f->driven > 0) want[c++] = f->driven;
    if (f->mass_net.degree > 0) want[c++] = f->mass_net.degree, want[c++] = f->potential_net.degree;
    if (f->squares > 0) want[c++] = f->squares;
    CHECK(c == p->sizes);
    for (i = 0; i < c; i++)
        CHECK(p->bytes[8 + 2 * i] + 256 * p->bytes[9 + 2 * i] == want[i]);
    CHECK(memcmp(p->bytes + p->lead, &md->ae.slope, sizeof(roln_real)) == 0);
    CHECK(memcmp(p->bytes + p->lead + sizeof(roln_real), &f->eigenvalue_floor, sizeof(roln_real)) == 0);
}

/* Numbers of model k, own: with own units: a true autoencoder, otherwise any bits that may be unpacked. */
static void any_numbers(int k, int own, uint64_t *s, roln_real *x)
{
    const int n = n_OF(k), ae = roln_ae_params(&models[k]->md->ae);
    roln_real *range = x + 6 + own, *theta = range + 3 * n;
    int i;
    x[0] = models[k]->md->ae.slope, x[1] = models[k]->md->lnn.eigenvalue_floor;
    x[2] = models[k]->md->lnn.angles ? 1 : ROLN_C(0.3), x[3] = ROLN_C(0.7), x[4] = ROLN_C(1.7), range[-1] = dt;
    for (i = 0; i < own; i++)
        x[5 + i] = models[k]->md->lnn.angles >> i & 1 ? 1 : ROLN_C(0.1) * (roln_real)(i + 1);
    random_bits(3 * n, s, range);
    for (i = 0; i < n; i++) { /* z_min <= z_max, zd_max >= 0 */
        roln_real *lo = range + i, *hi = lo + n, *top = hi + n;
        const roln_real a = *lo;
        if (*lo > *hi) *lo = *hi, *hi = a;
        *top = ROLN_ABS(*top);
    }
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta, s, ROOM(init)));
    random_bits(models[k]->params - ae, s, theta + ae);
}

/* own: of the same model, but with own units. */
static void test_pack(int k, int own)
{
    static package p;
    static roln_model md;
    const roln_real odd[3] = {(roln_real)NAN, -(roln_real)INFINITY, -ROLN_C(0.0)};
    const int units = own ? N_OF(k) : 0;
    uint64_t s = 90;
    int i, j;
    md = *models[k]->md, md.own = own;
    package_of(&md, &p);
    CHECK(p.total == models[k]->packed + units * (int)sizeof *p.x && p.numbers == 6 + units + 3 * p.n + models[k]->params);
    any_numbers(k, units, &s, p.x);
    seal(&p);
    check_head(&p, 0);
    check_corruption(&p, 8, 401);
    for (i = 0; i <= p.total + 3; i++) { /* every length, in memory of that length */
        unsigned char *bytes;
        if (i == p.total) continue;
        bytes = (unsigned char *)malloc((size_t)i + 1);
        memset(bytes, 0, (size_t)i + 1);
        memcpy(bytes, p.bytes, (size_t)(i < p.total ? i : p.total));
        CHECK(roln_unpack(p.md, i, bytes, p.to) == ROLN_E_LENGTH);
        free(bytes);
    }
    CHECK(unpack(&p, -1) == ROLN_E_LENGTH && unpack(&p, -2147483647) == ROLN_E_LENGTH);
    for (i = 0; i < p.md->lnn.layers; i++) { /* ReEig, BiMap and other sizes than n, which there were before 0.4.0 */
        const int layers = p.md->lnn.layers, kind = 8 + 2 * (p.sizes - layers + i), size = kind - 2 * (layers + 1);
        for (j = 2; j <= 3; j++)
            p.bad[kind] = (unsigned char)j, CHECK(unpack(&p, p.total) == ROLN_E_SHAPE);
        p.bad[kind] = ROLN_GYRO, p.bad[size]++;
        CHECK(unpack(&p, p.total) == ROLN_E_SHAPE);
        p.bad[size]--;
    }
    for (i = 0; i < MODELS; i++) /* bytes of another model */
        if (i != k || own) {
            const roln_status st = roln_unpack(models[i]->md, p.total, p.bytes, p.to);
            if (format_of(models[i]->md) != format_of(&md)) CHECK(st == ROLN_E_FORMAT);
            else CHECK(st == ROLN_E_SHAPE || (st == ROLN_E_LENGTH && p.total < 8 + 2 * 40));
        }
    for (i = 0; i < p.numbers; i++) /* numbers, under a true checksum: other slope or least, bad scales, NaN */
        for (j = 0; j < 3; j++) {
            if (j == 2 && i > 4 + units) continue;
            CHECK(unpack_with(&p, i, odd[j]) == (i < 2 ? ROLN_E_SHAPE : ROLN_E_NOT_FINITE));
        }
    if (p.md->lnn.angles) CHECK(unpack_with(&p, 2, ROLN_C(0.5)) == ROLN_E_SHAPE); /* z of angles is q */
    for (i = 0; i < units; i++)
        if (p.md->lnn.angles >> i & 1) CHECK(unpack_with(&p, 5 + i, ROLN_C(0.5)) == ROLN_E_SHAPE);
    for (i = 0; i < units; i++)
        CHECK(unpack_with(&p, 5 + i, -1) == ROLN_E_NOT_FINITE);
    CHECK(all(MAXNUM, p.to, 7));
    CHECK(unpack(&p, p.total) == ROLN_OK && same(p.numbers, p.x, p.to) && all(MAXNUM - p.numbers, p.to + p.numbers, 7));
    CHECK(roln_fnv(6, (const unsigned char *)"foobar", ROLN_FNV) == UINT64_C(0x85944171f73967e8));
}

/* Files that are whole, but whose numbers make no sense. */
static void test_sealed(int k, int own)
{
    static package p;
    static roln_model md;
    const int n = n_OF(k), step = 5 + (own ? N_OF(k) : 0), low = step + 1, high = low + n, top = high + n, theta = top + n;
    uint64_t s = 91;
    int i, l, at = theta;
    md = *models[k]->md, md.own = own;
    package_of(&md, &p);
    any_numbers(k, step - 5, &s, p.x);
    p.x[step] = 0; /* the step, in no training yet */
    for (i = 0; i < n; i++)
        p.x[low + i] = -1, p.x[high + i] = 1, p.x[top + i] = 0;
    seal(&p);
    CHECK(unpack(&p, p.total) == ROLN_OK);
    fill(MAXNUM, 7, p.to);
    CHECK(unpack_with(&p, step, -dt) == ROLN_E_RANGE);
    for (i = 0; i < n; i++) {
        CHECK(unpack_with(&p, low + i, 1 + ROLN_EPS) == ROLN_E_RANGE &&
              unpack_with(&p, high + i, -1 - 2 * ROLN_EPS) == ROLN_E_RANGE);
        CHECK(unpack_with(&p, top + i, -ROLN_EPS) == ROLN_E_RANGE);
        CHECK(unpack_with(&p, low + i, 1) == ROLN_OK); /* a range may be a point */
        fill(MAXNUM, 7, p.to);
    }
    for (l = 0; l < p.md->ae.layers; l++) { /* Psi^T Phi = I no longer, by any one number of Phi or Psi */
        const int N = p.md->ae.size[l], m = p.md->ae.size[l + 1];
        for (i = 0; i < 2 * N * m; i++) {
            const roln_real was = p.x[at + i];
            const roln_status st = unpack_with(&p, at + i, was + 1);
            /* in a square layer every number matters; else only where the other matrix sees it */
            CHECK(st == ROLN_E_ILL_CONDITIONED || (st == ROLN_OK && N > m));
            if (st == ROLN_OK) fill(MAXNUM, 7, p.to);
        }
        CHECK(unpack_with(&p, at, p.x[at] + 100) == ROLN_E_ILL_CONDITIONED);
        CHECK(unpack_with(&p, at + N * m, p.x[at + N * m] + 100) == ROLN_E_ILL_CONDITIONED);
        at += 2 * N * m;
        CHECK(unpack_with(&p, at, 5) == ROLN_OK); /* a bias is free */
        fill(MAXNUM, 7, p.to);
        at += N;
    }
}

/* A model of three joints: bit 0 of kind: angles; 1: a driven joint; 2: polynomials of these degrees; 3: so many squares. */
static roln_model model_of(int kind, int degree, int of_v, int squares)
{
    roln_model md = *models[BARE]->md;
    roln_lnn *f = &md.lnn;
    const int in = kind & 1 ? 5 : 3;
    md.scheme = ROLN_RK4;
    f->base = 0, f->mass = ROLN_CHOLESKY;
    f->angles = kind & 1 ? 5 : 0, f->driven = kind >> 1 & 1;
    f->mass_net.size[0] = f->potential_net.size[0] = f->damper_net.size[0] = in;
    if (kind & 4) {
        f->mass_net.degree = f->damper_net.degree = degree, f->potential_net.degree = of_v;
        f->mass_net.size[1] = f->damper_net.size[1] = in + ROLN_MONOMIALS(in, degree);
        f->potential_net.size[1] = in + ROLN_MONOMIALS(in, of_v);
    }
    if (kind & 8) f->squares = squares, f->mass_net.size[2] = 3 * squares;
    return md;
}

/* The sizes that not every model has, in all combinations; bytes of other degrees, or of other columns. */
static void test_last_sizes(void)
{
    static package p;
    static roln_model md, other;
    int kind, i;
    for (kind = 0; kind < 16; kind++) {
        md = model_of(kind, 2, 3, 4);
        package_of(&md, &p);
        fill(p.numbers, ROLN_C(0.25), p.x);
        p.x[0] = md.ae.slope, p.x[1] = md.lnn.eigenvalue_floor, p.x[2] = 1;
        seal(&p), check_head(&p, 0), check_corruption(&p, 0, 997);
        for (i = 0; i < 4; i++) {
            const int polynomials = i < 2, differs = polynomials ? kind & 4 : kind & 8;
            other = model_of(kind, 2 + (i == 0), 3 + (i == 1), i == 2 ? 5 : i == 3 ? 3 : 4);
            if (differs) CHECK(roln_unpack(&other, p.total, p.bytes, p.to) == ROLN_E_SHAPE);
        }
        for (i = 0; i < 16; i++) {
            roln_status st = ROLN_OK;
            other = model_of(i, 2, 3, 4);
            if (i != kind) st = roln_unpack(&other, p.total, p.bytes, p.to);
            CHECK(st == (i == kind ? ROLN_OK : format_of(&other) == format_of(&md) ? ROLN_E_SHAPE : ROLN_E_FORMAT));
        }
        CHECK(all(MAXNUM, p.to, 7));
        CHECK(unpack(&p, p.total) == ROLN_OK && same(p.numbers, p.x, p.to) && all(MAXNUM - p.numbers, p.to + p.numbers, 7));
    }
}

/* ---- written parameters ----------------------------------------------------------------------- */

static char text[400000], whole[400000];
static void put(void *ctx, const char *piece)
{
    size_t *at = (size_t *)ctx, len = strlen(piece);
    CHECK(*at + len < sizeof text);
    memcpy(text + *at, piece, len + 1);
    *at += len;
}

/* One number at *p, as the compiler would read it: [-] digits '.' [f] { (* or /) digits '.' [f] } */
static int read_real(const char **p, roln_real *x)
{
    char *end, op = 0;
    for (*x = 0;; op = *(*p)++) {
        const int sign = op == 0 && **p == '-';
        roln_real v;
        if (sign) ++*p;
        if (**p < '0' || **p > '9') return 0;
        v = (roln_real)strtod(*p, &end);
        if (end[-1] != '.' || (sizeof *x == 4 && *end++ != 'f')) return 0;
        if (op == '*') *x *= v;
        else if (op == '/') *x /= v;
        else *x = sign ? -v : v;
        *p = end;
        if (**p != '*' && **p != '/') return 1;
    }
}

/* The numbers x [count] of md are written as they are. */
static void check_write(const roln_model *md, int count, const roln_real *x)
{
    static const char head[] = "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n";
    static const char tail[] = "}};\n#endif\n#endif\n";
    const char *at = text;
    roln_real y;
    size_t len = 0;
    int lists = 0, column = 0, i;
    CHECK(roln_write(md, "plain", x, put, &len) == ROLN_OK);
    at = strstr(text, head);
    CHECK(at != NULL && strcmp(text + len - strlen(tail), tail) == 0);
    if (!at) return;
    at += strlen(head);
    for (i = 0; i < count; i++) {
        const size_t gap = strspn(at, " ,{}\n");
        if (memchr(at, '{', gap) || memchr(at, '}', gap)) column = 0;
        else if (memchr(at, '\n', gap)) CHECK(column == 8), column = 0; /* eight a line */
        CHECK(column++ < 8);
        at += gap;
        CHECK(read_real(&at, &y) && same(1, &y, x + i));
    }
    CHECK(strcmp(at, tail) == 0);
    for (at = text, i = 0; *at; at++)
        i += (*at == '{') - (*at == '}'), lists += *at == '{';
    CHECK(i == 0 && lists == 6 + md->own);
    CHECK(strstr(text, md->own ? "plain_weights_are_of_ROLN_SCALE_each[plain_own == 1 ?"
                               : "plain_weights_are_of_ROLN_SCALE_common[plain_own == 0 ?") != NULL);
}

static void test_write(void)
{
    static const roln_real edge[8] = {0,
                                      PICK(1e-45f, 4.9406564584124654e-324),
                                      PICK(3.4028235e38f, 1.7976931348623157e308),
                                      PICK(1.17549435e-38f, 2.2250738585072014e-308),
                                      PICK(1.1754942e-38f, 2.225073858507201e-308),
                                      1,
                                      PICK(16777216, 9007199254740992.0),
                                      ROLN_C(0.1)};
    enum { NUMBERS = 6 + 6 + plain_theta_size };
    static plain_params p;
    roln_model own = plain_model;
    roln_real x[NUMBERS + plain_N];
    uint64_t s = 95;
    size_t len = 0;
    int i;
    own.own = 1;
    random_bits(NUMBERS + plain_N, &s, x);
    for (i = 0; i < 16; i++)
        x[2 + i] = i % 2 ? -edge[i / 2] : edge[i / 2];
    for (i = 0; i < 2; i++) { /* of another config: nothing is written */
        x[i] = i ? plain_model.ae.slope * (1 + ROLN_EPS) : 0, x[1] = plain_model.lnn.eigenvalue_floor;
        memcpy(&p, x, sizeof p);
        CHECK(plain_write(&p, put, &len) == ROLN_E_SHAPE && len == 0);
    }
    x[0] = plain_model.ae.slope;
    CHECK(sizeof p == NUMBERS * sizeof *x);
    check_write(&plain_model, NUMBERS, x), check_write(&own, NUMBERS + plain_N, x);
    memcpy(&p, x, sizeof p);
    roln_write(&plain_model, "plain", &p, put, &len), memcpy(whole, text, len + 1);
    CHECK(strstr(text, "*1152921504606846976") != NULL); /* powers of two in steps of 2^60 */
    len = 0;
    CHECK(plain_write(&p, put, &len) == ROLN_OK && strcmp(text, whole) == 0);
    x[6] = (roln_real)NAN, len = 0;
    CHECK(roln_write(&own, "plain", x, put, &len) == ROLN_E_NOT_FINITE && len == 0);
}

/* What the text demands of a config: enumerators with the values that they have where the model is defined, in 15 types whose names
   are the compiler's complaints. */
#define ENUMERATORS(X, of, networks, mass) \
    X(of, N) X(of, N1) X(of, N2) X(of, N3) X(of, N4) X(of, N5) X(of, N6) X(of, N7) X(of, N8) networks(X, of) \
    X(of, scheme) X(of, degree) mass(X, of) X(of, base) X(of, L0) X(of, L1) X(of, L2) X(of, L3) \
    X(of, damping) X(of, friction) X(of, angles) X(of, own) X(of, inputs) X(of, stored) X(of, twice) X(of, format)
#define OF_MLP(X, of) X(of, H1) X(of, H2) X(of, H3) X(of, H4) X(of, H5)
#define OF_POLYNOMIALS(X, of) X(of, degree_m) X(of, degree_v)
#define OF_CHOLESKY(X, of) X(of, cholesky)
#define OF_SQUARES(X, of) X(of, squares)
#define OF_NO_SQUARES(X, of) X(of, cholesky) X(of, squares)
#define ENUMERATOR(of, name) {#of "_" #name, of##_##name},
#define OWN_WORDS PICK("DOUBLE_not_defined_0", "DOUBLE_defined_1")
enum { NEEDS = 15 };
typedef struct {
    const char *name;
    int value;
} enumerator;

static void check_needs(const roln_model *md, const char *name, int needed, const enumerator *is, const char *const *words)
{
    char want[400];
    const char *at = text;
    size_t len = 0;
    const rolni_text to = {name, put, &len};
    int need, i = 0;
    rolni_write_needs(&to, md);
    for (need = 0; need < NEEDS; need++) {
        int more = 0;
        snprintf(want, sizeof want, "typedef char %s_weights_are_of_ROLN_%s[", name, words[need]);
        CHECK(strncmp(at, want, strlen(want)) == 0);
        for (at += strlen(want); i < needed; i++, more = 1) {
            snprintf(want, sizeof want, "%s%s == %d", more ? " && " : "", is[i].name, is[i].value);
            if (strncmp(at, want, strlen(want)) != 0) break;
            at += strlen(want);
        }
        if (!CHECK(more && strncmp(at, " ? 1 : -1];\n", 12) == 0)) return;
        at += 12;
    }
    CHECK(i == needed && *at == 0);
}

/* Each bit of each number changes the mark. So does a swap of two numbers. */
static void test_mark(void)
{
    enum { N = 6 };
    roln_real x[N];
    uint64_t seed = 3;
    roln_bits mark;
    int i, k;
    for (i = 0; i < N; i++)
        x[i] = roln_normal(&seed);
    mark = rolni_mark(N, x, 0);
    CHECK(rolni_mark(0, x, mark) == mark && rolni_mark(2, x + 4, rolni_mark(4, x, 0)) == mark);
    for (i = 0; i < N; i++)
        for (k = 0; k < (int)(8 * sizeof *x); k++) {
            const roln_real was = x[i];
            x[i] = rolni_real(rolni_bits(was) ^ (roln_bits)1 << k);
            CHECK(rolni_mark(N, x, 0) != mark);
            x[i] = was;
        }
    for (i = 0; i < N; i++)
        for (k = 0; k < i; k++) {
            const roln_real was = x[i];
            x[i] = x[k], x[k] = was;
            CHECK(rolni_mark(N, x, 0) != mark);
            x[k] = x[i], x[i] = was;
        }
}

static void test_needs(void)
{
#define NEEDS_OF(of, ...) NEEDS_WITH(of, OF_MLP, OF_CHOLESKY, "FORMAT_3", __VA_ARGS__)
#define NEEDS_WITH(of, networks, mass, format, ...) \
    { \
        static const enumerator is[] = {ENUMERATORS(ENUMERATOR, of, networks, mass)}; \
        static const char *const words[NEEDS] = {__VA_ARGS__, OWN_WORDS, format}; \
        check_needs(&of##_model, #of, (int)(sizeof is / sizeof *is), is, words); \
    }
    NEEDS_OF(plain, "AE_6_4_2", "MLP_5_4", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0", "DAMPING_0",
             "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "QUANTISE_full")
    NEEDS_OF(deep, "AE_10_9_8_7_6_5_4_3_2", "MLP_3_2_3_2_3", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_0",
             "LAYERS_0", "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "QUANTISE_full")
    NEEDS_OF(rich, "AE_6_5_3", "MLP_4_3", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_1", "LAYERS_gyro",
             "DAMPING_1", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_2", "QUANTISE_full")
    NEEDS_OF(layered, "AE_2", "MLP_3", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_gyro_gyro_gyro_gyro",
             "DAMPING_1", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "QUANTISE_full")
    NEEDS_OF(delan, "AE_4_2", "MLP_4", "INTEGRATOR_euler", "CHART_none_0", "MASS_cholesky", "BASE_0", "LAYERS_0", "DAMPING_0",
             "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "QUANTISE_full")
    NEEDS_OF(curved, "AE_6_4_3", "MLP_4_3", "INTEGRATOR_midpoint", "CHART_polynomial_2", "MASS_exponential", "BASE_0", "LAYERS_0",
             "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_2", "QUANTISE_full")
    NEEDS_OF(wheel, "AE_3", "MLP_4_5", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0", "DAMPING_1",
             "FRICTION_1", "ANGLES_1_0_1_bits_5", "SCALE_common", "INPUTS_0", "QUANTISE_full")
    NEEDS_WITH(bowl, OF_POLYNOMIALS, OF_SQUARES, "FORMAT_5", "AE_5_2", "POLYNOMIALS_2_3", "INTEGRATOR_rk4", "CHART_polynomial_2",
               "MASS_squares_3", "BASE_0", "LAYERS_0", "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0",
               "QUANTISE_full")
    NEEDS_WITH(gantry, OF_POLYNOMIALS, OF_NO_SQUARES, "FORMAT_5", "AE_2", "POLYNOMIALS_2_2", "INTEGRATOR_rk4", "CHART_none_0",
               "MASS_exponential", "BASE_0", "LAYERS_0", "DAMPING_1", "FRICTION_2", "ANGLES_0_1_bits_2", "SCALE_common", "INPUTS_0",
               "QUANTISE_full")
    CHECK(bowl_H1 == 0 && gantry_H1 == 0); /* they refuse weights of perceptrons */
#ifndef ROLN_DOUBLE
    NEEDS_OF(stored, "AE_6_4_2", "MLP_5_4", "INTEGRATOR_rk4", "CHART_none_0", "MASS_exponential", "BASE_0", "LAYERS_0",
             "DAMPING_0", "FRICTION_0", "ANGLES_0", "SCALE_common", "INPUTS_0", "QUANTISE_int8")
#endif
#undef NEEDS_OF
#undef NEEDS_WITH
}

#ifndef ROLN_DOUBLE
/* ---- stored weights --------------------------------------------------------------------------- */

/* The sizes that the size macros of roln_ae.h ask for. */
static struct {
    int N, n, N1, N2, ae_sum, monomials, bent, ae_size, keeps;
} of;
#define OF(name) of.name

/* Full parameters theta of model k, as md stores them; the samples are within lo .. hi. */
static roln_status store(int k, const roln_model *md, const float *theta, const float *lo, const float *hi, float *to)
{
    const roln_ae *ae = &md->ae;
    const int full = roln_ae_params(&models[k]->md->ae), rest = models[k]->params - full;
    roln_status st;
    of.N = ae->size[0], of.n = ae->size[ae->layers], of.N1 = roln_ae_width(ae, 1), of.N2 = roln_ae_width(ae, 2);
    of.ae_sum = roln_ae_sum(ae), of.monomials = ae->monomials, of.bent = roln_ae_bent(ae), of.ae_size = roln_ae_params(ae);
    st = roln_ae_quantise(ae, theta, lo, hi, to, room_of(ROLN_AE_QUANTISE_WORK(OF)));
    ROOM_KEPT();
    if (st == ROLN_OK) memcpy(to + of.ae_size, theta + full, (size_t)rest * sizeof *to);
    return st;
}

/* Words among the weights may look like NaN, infinity, anything; they are written as they are. A number may not. */
static void check_written(const roln_model *md, package *p)
{
    static const char head[] = "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n    {{\n";
    static const char tail[] = "\n}};\n#endif\n#define mx_weights mx_flash.params\n#endif\n";
    float *theta = p->x + 6 + 3 * p->n;
    const char *at;
    size_t len = 0;
    int i, nan = 0, number = -1;
    for (i = 0; i < roln_params(md); i++) {
        const uint32_t words[4] = {UINT32_C(0xffffffff), UINT32_C(0x7f800001), UINT32_C(0xff800000) + (uint32_t)i, 0xff800000};
        if (roln_ae_is_number(&md->ae, i)) number = number < 0 ? i : number;
        else memcpy(theta + i, words + i % 4, sizeof *words), nan++;
    }
    CHECK(nan > 0 && number >= 0);
    CHECK_OK(roln_write(md, "mx", p->x, put, &len));
    at = strstr(text, head);
    CHECK(at != NULL && strcmp(text + len - strlen(tail), tail) == 0);
    if (!at) return;
    at += strlen(head) - 1;
    for (i = 0; i < p->numbers; i++) { /* all numbers, in the order of NAME_params */
        uint32_t want;
        char *end = NULL;
        memcpy(&want, p->x + i, sizeof want);
        at += strspn(at, " \n");
        CHECK(at[0] == '0' && at[1] == 'x' && strtoul(at, &end, 16) == want && *end == ',' && end == at + 10);
        at = end + 1;
    }
    CHECK(*at == '\n' && at[1] == '}');
    len = 0, theta[number] = INFINITY;
    CHECK(roln_write(md, "mx", p->x, put, &len) == ROLN_E_NOT_FINITE && len == 0);
}

/* One of the small models with its weights stored: packed, every byte of it, unpacked, written. */
static void test_stored(int k, const roln_storage *storage)
{
    static package p;
    static float theta[MAXP];
    roln_model md = *models[k]->md;
    const int n = n_OF(k), all_params = models[k]->params, nets = all_params - roln_ae_params(&models[k]->md->ae);
    float *range = p.x + 6, *weights_of = range + 3 * n, was;
    uint64_t s = 140 + (uint64_t)k;
    int params, i;
    md.ae.storage = storage, params = roln_params(&md);
    package_of(&md, &p);
    parameters(k, &s, theta);
    was = theta[0];
    p.x[0] = md.ae.slope, p.x[1] = md.lnn.eigenvalue_floor, p.x[2] = 0.3f, p.x[3] = 0.7f, p.x[4] = 1.7f, p.x[5] = dt;
    for (i = 0; i < 3 * n; i++)
        range[i] = i < n ? -1 : 1;
    theta[0] = NAN;
    fill(MAXP, 7, weights_of);
    CHECK(store(k, &md, theta, range, range + n, weights_of) == ROLN_E_NOT_FINITE && all(params, weights_of, 7));
    theta[0] = was;
    CHECK_OK(store(k, &md, theta, range, range + n, weights_of));
    CHECK(same(nets, weights_of + params - nets, theta + all_params - nets));
    seal(&p);
    check_head(&p, storage->bits);
    check_corruption(&p, 0, 101);
    for (i = 0; i < params; i++) { /* NaN under a true checksum: refused among numbers; among words it is a matter of Psi^T Phi */
        const roln_status st = unpack_with(&p, 6 + 3 * n + i, NAN);
        if (roln_ae_is_number(&md.ae, i)) CHECK(st == ROLN_E_NOT_FINITE);
        else CHECK(st == ROLN_OK || st == ROLN_E_ILL_CONDITIONED || (st == ROLN_E_NOT_FINITE && storage->bits == 16));
        if (st == ROLN_OK) fill(MAXNUM, 7, p.to);
    }
    CHECK(roln_unpack(models[k]->md, p.total, p.bytes, p.to) == ROLN_E_SHAPE && all(MAXNUM, p.to, 7));
    CHECK(unpack(&p, p.total) == ROLN_OK && same(p.numbers, p.to, p.x));
    check_written(&md, &p);
}

/* Linearisation of a step under torques against differences. */
static void check_stored_linear(const stored_params *p, const stored_latent *s, const float *tau)
{
    static stored_linear_work lin;
    static stored_work work;
    const float h = 1.f / 64;
    stored_jacobian jac;
    stored_latent u = *s;
    float moved[6], up[4], down[4];
    int i, j;
    CHECK_OK(stored_linear(p, &u, tau, dt, &jac, &lin));
    for (j = 0; j < 6; j++) {
        memcpy(moved, tau, sizeof moved);
        moved[j] = tau[j] + h, u = *s;
        CHECK_OK(stored_step(p, &u, moved, dt, &work.step));
        memcpy(up, &u, sizeof up);
        moved[j] = tau[j] - h, u = *s;
        CHECK_OK(stored_step(p, &u, moved, dt, &work.step));
        memcpy(down, &u, sizeof down);
        for (i = 0; i < 4; i++)
            CHECK_NEAR(jac.B[6 * i + j], (up[i] - down[i]) / (2 * h), 2e-4);
    }
}

/* Stored parameters encode, decode, step as the full ones do, nearly. */
static void check_stored_motion(const plain_params *p, const stored_params *a, const float *q, const float *qd)
{
    static plain_work work;
    static stored_work stored;
    plain_state x;
    stored_state y;
    plain_latent s;
    stored_latent t, u;
    int i;
    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd), memcpy(&y, &x, sizeof y);
    CHECK_OK(plain_encode(p, &x, &s, &work.encode));
    CHECK_OK(stored_encode(a, &y, &t, &stored.encode));
    for (i = 0; i < 2; i++)
        CHECK_NEAR(t.z[i], s.z[i], 0.02), CHECK_NEAR(t.zd[i], s.zd[i], 0.04);
    CHECK_OK(plain_decode(p, &s, &x, &work.decode));
    CHECK_OK(stored_decode(a, &t, &y, &stored.decode));
    for (i = 0; i < 6; i++)
        CHECK_NEAR(y.q[i], x.q[i], 0.03), CHECK_NEAR(y.qd[i], x.qd[i], 0.06);
    CHECK_OK(stored_encode(a, &y, &u, &stored.encode));
    for (i = 0; i < 2; i++)
        CHECK_NEAR(u.z[i], t.z[i], 1e-3), CHECK_NEAR(u.zd[i], t.zd[i], 1e-3);
    check_stored_linear(a, &t, q);
}

/* The typed way: bytes of the full model, stored. */
static void test_stored_shell(void)
{
    static plain_params p;
    static stored_params a, b;
    static stored_words words;
    static plain_start init;
    static plain_train train;
    static unsigned char full[plain_packed_size], bytes[stored_packed_size];
    stored_quantise_work *start = (stored_quantise_work *)(void *)room_of((int)(sizeof *start / sizeof(float)));
    float q[24], qd[24];
    uint64_t seed = 11;
    CHECK_OK(plain_init(&p, &seed, &init.init));
    dyadic(24, 1, &seed, q), dyadic(24, 1, &seed, qd);
    plain_pack(&p, full);
    memset(&b, 7, sizeof b), a = b;
    CHECK(stored_quantise(plain_packed_size, full, &a, start) == ROLN_E_RANGE && memcmp(&a, &b, sizeof a) == 0); /* no range yet */
    CHECK_OK(plain_fit_range(&p, 4, q, qd, &train.fit_range));
    p.dt = dt;
    plain_pack(&p, full);
    CHECK(stored_quantise(plain_packed_size - 1, full, &a, start) == ROLN_E_LENGTH);
    full[300] ^= 1;
    CHECK(stored_quantise(plain_packed_size, full, &a, start) == ROLN_E_CHECKSUM && memcmp(&a, &b, sizeof a) == 0);
    full[300] ^= 1;
    p.theta[plain_theta_size - 1] += (float)NAN, plain_pack(&p, full); /* of the networks */
    CHECK(stored_quantise(plain_packed_size, full, &a, start) == ROLN_E_NOT_FINITE && memcmp(&a, &b, sizeof a) == 0);
    p.theta[plain_theta_size - 1] = 0.25f, plain_pack(&p, full);
    CHECK_OK(stored_quantise(plain_packed_size, full, &a, start));
    CHECK_ROOM();
    CHECK((int)stored_packed_size < (int)plain_packed_size);
    CHECK(memcmp(&a.scale, &p.scale, sizeof a.scale) == 0 && same(1, &a.dt, &p.dt) && a.slope == p.slope &&
          a.eigenvalue_floor == p.eigenvalue_floor);
    CHECK(same(2, a.z_min, p.z_min) && same(2, a.z_max, p.z_max) && same(2, a.zd_max, p.zd_max));
    stored_pack(&a, bytes);
    CHECK(stored_unpack(stored_packed_size, bytes, &b) == ROLN_OK && memcmp(&a, &b, sizeof a) == 0);
    CHECK(stored_quantise(stored_packed_size, bytes, &b, start) != ROLN_OK && memcmp(&a, &b, sizeof a) == 0); /* stored already */
    CHECK(sizeof words == sizeof a && stored_theta_size == roln_params(&stored_model));
    CHECK((int)stored_full_size == (int)plain_theta_size);
    words.params = a; /* as flash holds it */
    check_stored_motion(&p, &words.params, q, qd);
}
#endif

void TEST_NAME(pack)(void)
{
    int k, own;
    for (k = 0; k < MODELS; k++) {
        for (own = 0; own < 2; own++)
            test_pack(k, own), test_sealed(k, own);
#ifndef ROLN_DOUBLE
        if (models[k]->md->ae.layers > 0) test_stored(k, &roln_half), test_stored(k, &roln_int8);
#endif
    }
#ifndef ROLN_DOUBLE
    test_stored_shell();
#endif
    test_last_sizes();
    test_write();
    test_needs();
    test_mark();
    print_bounds();
}
