/* SPDX-License-Identifier: MIT */
/* fuzz_packed.c - packed bytes: an input chooses a model and is a row of commands that damage its packet, and have it read.
   NAME_unpack takes what a second reader takes, written from the format's description; NAME_quantise of small weights nothing else,
   but may refuse more, a model without a range of z; NAME_params_mismatch is asked of what was taken. Parameters stay as they were
   unless ROLN_OK; what was taken packs to the same bytes. */

#define ROLN_NAME plain
#define ROLN_AE 5, 3, 2
#define ROLN_MLP 3
#include "roln.h"

#define ROLN_NAME curved
#define ROLN_AE 5, 3, 2
#define ROLN_MLP 2, 2
#define ROLN_CHART polynomial, 2
#define ROLN_SLOPE 0.5
#include "roln.h"

#define ROLN_NAME wheel
#define ROLN_AE 3
#define ROLN_MLP 3
#define ROLN_ANGLES 1, 0, 1
#define ROLN_SCALE each
#define ROLN_FRICTION 1
#include "roln.h"

#define ROLN_NAME carts
#define ROLN_AE 4, 2
#define ROLN_MLP 3
#define ROLN_SCALE each
#define ROLN_INPUTS 1
#define ROLN_INTEGRATOR midpoint
#include "roln.h"

#define ROLN_NAME layered
#define ROLN_AE 2
#define ROLN_MLP 3
#define ROLN_LAYERS gyro, gyro
#define ROLN_EIGENVALUE_FLOOR 0.015625
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#include "roln.h"

#ifndef ROLN_DOUBLE
#define ROLN_NAME bytes
#define ROLN_AE 5, 3, 2
#define ROLN_MLP 3
#define ROLN_QUANTISE int8
#include "roln.h"

#define ROLN_NAME halves
#define ROLN_AE 5, 3, 2
#define ROLN_MLP 2, 2
#define ROLN_CHART polynomial, 2
#define ROLN_SLOPE 0.5
#define ROLN_QUANTISE half
#include "roln.h"
#endif

#include <math.h>
#include <string.h>
#include "fuzz.h"

/* A model as the commands see it. */
typedef struct {
    const roln_model *md;
    int packed, numbers, full;       /* bytes; numbers; bytes of the full model that is stored small, 0: it is not */
    roln_status (*unpack)(int count, const unsigned char *bytes, void *p);
    roln_status (*store)(int count, const unsigned char *bytes, void *p);
    void (*pack)(const void *p, unsigned char *bytes);
    int (*foreign)(const void *p);
} model;

#define OF(of) \
    static roln_status of##_unpack_of(int count, const unsigned char *b, void *p) \
    { \
        return of##_unpack(count, b, (of##_params *)p); \
    } \
    static void of##_pack_of(const void *p, unsigned char *b) \
    { \
        of##_pack((const of##_params *)p, b); \
    } \
    static int of##_foreign_of(const void *p) \
    { \
        return of##_params_mismatch((const of##_params *)p); \
    }
#define STORE(of) \
    static roln_status of##_store_of(int count, const unsigned char *b, void *p) \
    { \
        static of##_start work; \
        FUZZ_SPOIL(&work, sizeof work); \
        return of##_quantise(count, b, (of##_params *)p, &work.quantise); \
    }
OF(plain) OF(curved) OF(wheel) OF(carts) OF(layered)
#define MODEL(of, full, store) \
    {&of##_model, of##_packed_size, of##_numbers, full, of##_unpack_of, store, of##_pack_of, of##_foreign_of}
enum { PLAIN, CURVED, WHEEL, CARTS, LAYERED, FULL, BYTES = FULL, HALVES };
#ifndef ROLN_DOUBLE
OF(bytes) OF(halves) STORE(bytes) STORE(halves)
#endif
static const model models[] = {
    MODEL(plain, 0, NULL), MODEL(curved, 0, NULL), MODEL(wheel, 0, NULL), MODEL(carts, 0, NULL), MODEL(layered, 0, NULL),
#ifndef ROLN_DOUBLE
    MODEL(bytes, plain_packed_size, bytes_store_of), MODEL(halves, curved_packed_size, halves_store_of)
#endif
};
enum { MODELS = sizeof models / sizeof *models, MOST = 8192 };

/* Of each model its packet, undamaged, and parameters that nothing has written yet. */
static unsigned char *valid[MODELS];
static roln_real *params[MODELS];
static roln_real marked[MOST / sizeof(roln_real)];

#define INIT(of, at) \
    { \
        static of##_start start; \
        uint64_t seed = at + 1; \
        of##_params p; \
        int i; \
        CLAIM(of##_init(&p, &seed, &start.init) == ROLN_OK); \
        p.dt = ROLN_C(0.01); \
        for (i = 0; i < of##_n; i++) \
            p.z_min[i] = -1, p.z_max[i] = 1, p.zd_max[i] = 5; \
        of##_pack(&p, valid[at]); \
    }
static void begin(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        valid[k] = malloc((size_t)models[k].packed);
        params[k] = malloc((size_t)models[k].numbers * sizeof(roln_real)); /* each by itself: writes beyond it are seen */
        CLAIM(valid[k] && params[k] && models[k].packed <= MOST);
    }
    INIT(plain, PLAIN) INIT(curved, CURVED) INIT(wheel, WHEEL) INIT(carts, CARTS) INIT(layered, LAYERED)
    for (k = 0; k < (int)(sizeof marked / sizeof *marked); k++)
        marked[k] = 7;
    for (k = FULL; k < MODELS; k++) {
        CLAIM(models[k].store(models[k].full, valid[k - FULL], params[k]) == ROLN_OK);
        models[k].pack(params[k], valid[k]);
    }
}

/* ---- a second reader ---- */

static uint64_t number_at(const unsigned char *p, int bytes)
{
    uint64_t x = 0;
    while (bytes-- > 0)
        x = x << 8 | p[bytes];
    return x;
}

static void seal(int count, unsigned char *bytes)
{
    uint64_t h = 14695981039346656037u;
    int i;
    for (i = 0; i < count - 8; i++)
        h = (h ^ bytes[i]) * 1099511628211u;
    for (; i < count; i++, h >>= 8)
        bytes[i] = (unsigned char)(h & 255);
}

static int sealed(int count, const unsigned char *bytes)
{
    uint64_t h = 14695981039346656037u;
    int i;
    for (i = 0; i < count - 8; i++)
        h = (h ^ bytes[i]) * 1099511628211u;
    return number_at(bytes + count - 8, 8) == h;
}

static double real_at(const unsigned char *p, int i)
{
    const int size = (int)sizeof(roln_real);
    return (double)fuzz_bits((roln_bits)number_at(p + (size_t)i * sizeof(roln_real), size));
}

/* |Psi^T Phi - I|_F of a layer of full weights. */
static double off(const unsigned char *theta, int N, int n)
{
    double sum = 0;
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            double e = i == j ? -1 : 0;
            for (k = 0; k < N; k++)
                e += real_at(theta, i * N + k) * real_at(theta, (n + j) * N + k);
            sum += e * e;
        }
    return sqrt(sum);
}

/* Is a packet of model k to be taken? -1: this reader does not know. */
static int is_good(int k, int count, const unsigned char *bytes)
{
    const model *m = models + k;
    const int size = (int)sizeof(roln_real), n = m->md->lnn.n, own = m->md->own ? m->md->ae.size[0] : 0;
    const int lead = m->packed - 8 - m->numbers * size, range = 6 + own, theta = range + 3 * n;
    const unsigned char *p = bytes + lead, *layer = p + theta * size;
    int i, l, unsure = k >= FULL;
    if (count != m->packed || memcmp(bytes, valid[k], (size_t)(lead + 2 * size)) != 0 || !sealed(count, bytes)) return 0;
    for (i = 0; i < m->numbers; i++)
        if ((k < FULL || i < theta) && !isfinite(real_at(p, i))) return 0;
    for (i = 2; i < 5 + own; i++)
        if (real_at(p, i) <= 0) return 0;
    for (i = 0; m->md->lnn.angles && i < own; i++)
        if ((real_at(p, 5 + i) != 1 && m->md->lnn.angles >> i & 1) || real_at(p, 2) != 1) return 0;
    if (real_at(p, 5 + own) < 0) return 0;
    for (i = range; i < range + n; i++)
        if (real_at(p, i) > real_at(p, i + n) || real_at(p, i + 2 * n) < 0) return 0;
    for (l = 0; l < m->md->ae.layers && k < FULL; l++) {
        const int N = m->md->ae.size[l], to = m->md->ae.size[l + 1];
        const double far = off(layer, N, to);
        if (!(far <= 1.02e-2)) return 0;
        unsure |= far > 1e-2;
        layer += (2 * N * to + N) * size;
    }
    return unsure ? -1 : 1;
}

/* ---- reading ---- */

/* Has count bytes, of which there are no more, read as model k: by NAME_unpack, or with small ones by NAME_quantise, which takes as
   long as a hundred of the others: twice in an input. */
static int stored;
static void read_as(int k, int small, int count, const unsigned char *bytes)
{
    const model *m = models + k;
    const size_t size = (size_t)m->numbers * sizeof(roln_real);
    unsigned char *exact, back[MOST];
    const int good = is_good(small ? k - FULL : k, count, bytes);
    roln_status st;
    if (small && ++stored > 2) return;
    exact = malloc(count ? (size_t)count : 1);
    CLAIM(exact != NULL);
    memcpy(exact, bytes, (size_t)count);
    memcpy(params[k], marked, size);
    st = small ? m->store(count, exact, params[k]) : m->unpack(count, exact, params[k]);
    fuzz_call();
    if (st != ROLN_OK) CLAIM(memcmp(params[k], marked, size) == 0);
    CLAIM(good != 0 || st != ROLN_OK);
    CLAIM(good != 1 || st == ROLN_OK || small);
    CLAIM(m->foreign(params[k]) == (st != ROLN_OK));
    fuzz_call();
    if (st == ROLN_OK) {
        m->pack(params[k], back);
        CLAIM(small ? m->unpack(m->packed, back, params[k]) == ROLN_OK : memcmp(back, bytes, (size_t)count) == 0);
        ((roln_bits *)(void *)params[k])[fuzz_now.seed & 1] ^= (roln_bits)1 << (fuzz_now.seed >> 1) % (8 * sizeof(roln_bits));
        CLAIM(m->foreign(params[k])); /* a bit of slope or eigenvalue_floor */
    }
    free(exact);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input in = {data, data + size};
    static unsigned char bytes[MOST];
    const int k = (int)fuzz_byte(&in) % MODELS, small = k >= FULL && fuzz_byte(&in) % 32 == 1, like = small ? k - FULL : k;
    const int count = models[like].packed, lead = count - 8 - models[like].numbers * (int)sizeof(roln_real);
    if (!valid[0]) begin();
    memcpy(bytes, valid[like], (size_t)count);
    memset(bytes + count, 0x5a, sizeof bytes - (size_t)count);
    fuzz_now.seed = size, stored = 0;
    while (in.at < in.end) {
        const unsigned command = fuzz_byte(&in), at = fuzz_pair(&in);
        const size_t number = (size_t)lead + at % (unsigned)models[like].numbers * sizeof(roln_real);
        roln_bits b;
        switch (command % 8) {
        case 0: bytes[at % (unsigned)count] = (unsigned char)fuzz_byte(&in); break;
        case 1: bytes[at % (unsigned)count] ^= (unsigned char)(1 << (command >> 3) % 8); break;
        case 2: bytes[at % (unsigned)(lead + 2)] = (unsigned char)fuzz_byte(&in); break;
        case 3: /* a number of any kind, of the first ones, or any */
            fuzz_now.seed = fuzz_byte(&in);
            {
                const roln_real x = fuzz_kind((int)(command >> 4 & 7), &fuzz_now.seed);
                memcpy(&b, &x, sizeof b); /* of a machine with this order of bytes */
                memcpy(bytes + (command & 128 ? number : (size_t)lead + at % 16 * sizeof b), &b, sizeof b);
            }
            break;
        case 4: memcpy(bytes, valid[like], (size_t)count); break;
        case 5: read_as(k, small, command & 8 ? (int)(at % MOST) : (int)at % (lead + 16), bytes); break;
        case 6: read_as(k, small, count, bytes); break;
        default: seal(count, bytes), read_as(k, small, count, bytes); break;
        }
    }
    seal(count, bytes), read_as(k, small, count, bytes);
    return 0;
}
