/* hash.c - the promise of equal bits, as one line: FNV-1a 64 over the little-endian bits of parameters and optimiser
   state after 200 training steps, then of z, zd, q, qd after each of 1000 steps of a roll-out. See hash.sh. */
#define ROLN_NAME net
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 16, 16
#define ROLN_HORIZON 4
#define ROLN_BLOCK 8
#include "../roln.h"

#include <stdio.h>
#include <stdlib.h>

enum { SAMPLES = 512, BATCH = 8, H = 4, UPDATES = 200, STEPS = 1000 };

static uint64_t hash = ROLN_FNV;

static void add(int n, const roln_real *x)
{
    unsigned char b[sizeof(roln_real)], *p;
    for (; n > 0; n--, x++) {
        p = b;
        rolni_put_reals(&p, 1, x);
        hash = roln_fnv((int)sizeof b, b, hash);
    }
}

static void must(roln_status st, const char *what)
{
    if (st == ROLN_OK) return;
    fprintf(stderr, "%s: status %d\n", what, (int)st);
    exit(1);
}

/* Two oscillators, stepped by + and *, seen through six channels with a little of their product. */
static void record(uint64_t *s, roln_real h, roln_real *q, roln_real *qd)
{
    roln_real a[2] = {1, ROLN_C(0.5)}, v[2] = {0, 1}, w2[2] = {1, 2}, mix[6][3];
    int k, c, i;
    for (c = 0; c < 18; c++) mix[c / 3][c % 3] = roln_normal(s) * (c % 3 == 2 ? ROLN_C(0.125) : ROLN_C(0.5));
    for (k = 0; k < SAMPLES; k++) {
        for (c = 0; c < 6; c++, q++, qd++) {
            *q = mix[c][0] * a[0] + mix[c][1] * a[1] + mix[c][2] * (a[0] * a[1]);
            *qd = mix[c][0] * v[0] + mix[c][1] * v[1] + mix[c][2] * (a[0] * v[1] + v[0] * a[1]);
        }
        for (i = 0; i < 2; i++) {
            v[i] -= h / 2 * w2[i] * a[i];
            a[i] += h * v[i];
            v[i] -= h / 2 * w2[i] * a[i];
        }
    }
}

int main(void)
{
    static roln_real q[SAMPLES * 6], qd[SAMPLES * 6], qbar[6];
    static net_params p;
    static net_optimiser o;
    static net_gradient g;
    static net_train train;
    static net_start init;
    static net_work work;
    static const roln_loss weights = ROLN_ODE_WEIGHTS;
    roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.005)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), ROLN_C(2e-5), 5};
    const roln_real h = ROLN_C(0.0625);
    roln_batch b;
    net_state x;
    net_latent z;
    uint64_t s = 2026;
    int start[BATCH], k, i;

    record(&s, h, q, qd);
    must(net_init_pod(&p, SAMPLES, q, qd, qbar, &s, &init), "init");
    b.count = BATCH, b.steps = H, b.stride = 1, b.start = start, b.q = q, b.qd = qd, b.qdd = NULL, b.tau = NULL;
    for (k = 0; k < UPDATES; k++) {
        for (i = 0; i < BATCH; i++) start[i] = roln_randint(SAMPLES - H, &s);
        memset(&g, 0, sizeof g);
        must(net_grad(&p, &weights, &b, h, &g, &train), "grad");
        must(net_update(&p, &opt, &o, &g, &train), "update");
    }
    add(2, &p.scale.q);
    add(net_theta_size, p.theta);
    add(2, &o.adam.b1);
    add(net_theta_size, o.m), add(net_moment_size, o.v), add(net_moment_size, o.v_max);

    memcpy(x.q, q, sizeof x.q), memcpy(x.qd, qd, sizeof x.qd);
    must(net_encode(&p, &x, &z, &work), "encode");
    for (k = 0; k < STEPS; k++) {
        must(net_step(&p, &z, k < 100 ? q + 6 * k : NULL, h / 4, &work), "step"); /* the data serve as a force, too */
        must(net_decode(&p, &z, &x, &work), "decode");
        add(2, z.z), add(2, z.zd), add(6, x.q), add(6, x.qd);
    }
    if (getenv("HASH_VERBOSE")) printf("loss %g, q %g %g\n", (double)(g.loss.q + g.loss.qd + g.loss.zd + g.loss.qd_pred) / BATCH, (double)x.q[0], (double)x.qd[0]);
    printf("%s %016llx\n", sizeof(roln_real) == 4 ? "float" : "double", (unsigned long long)hash);
    return 0;
}
