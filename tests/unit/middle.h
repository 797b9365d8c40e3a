/* SPDX-License-Identifier: MIT */
/* middle.h - the middle of motion that never came there, for test_doubt.c. Include behind a model whose joints are its coordinates,
   with MIDDLE(x) = NAME_x. */
#define T__(x) MIDDLE(x)
#define T_(x) T__(test_##x)

/* A state of the motion, with positions within -1 .. 1. inner > 0: positions in all directions, `inner` to 1 from the middle; 0: on
   a closed curve, at the angle i / 100. */
static void T_(motion)(double inner, int i, uint64_t *seed, roln_real *q, roln_real *qd)
{
    enum { n = MIDDLE(n) };
    double r = 0, x[n];
    int j;
    for (j = 0; j < n; j++) {
        x[j] = inner > 0 ? (double)roln_normal(seed) : cos(0.01 * i + j);
        qd[j] = inner > 0 ? roln_normal(seed) : (roln_real)-sin(0.01 * i + j);
        r += x[j] * x[j];
    }
    r = inner > 0 ? (inner + (1 - inner) * (double)roln_uniform(seed)) / sqrt(r) : 1;
    for (j = 0; j < n; j++)
        q[j] = (roln_real)(r * x[j]);
}

/* Novelty of the middle, at rest, over the largest of 500 states of the motion that were not seen. */
static double T_(middle)(double inner)
{
    enum { n = MIDDLE(n), COUNT = 2000 };
    static roln_real q[COUNT * n], qd[COUNT * n];
    static MIDDLE(params) p;
    static MIDDLE(evidence) e;
    static MIDDLE(train) w;
    static MIDDLE(start) start;
    static MIDDLE(work) tick;
    const roln_batch b = {1, COUNT - 1, 1, NULL, q, qd, NULL, NULL};
    static MIDDLE(doubts) d;
    MIDDLE(latent) s;
    double most = 0;
    uint64_t seed = 9;
    int i;
    CHECK_OK(MIDDLE(init)(&p, &seed, &start.init));
    p.scale.q = p.scale.t = p.scale.m = 1, p.dt = ROLN_C(0.001);
    for (i = 0; i < COUNT; i++)
        T_(motion)(inner, i, &seed, q + i * n, qd + i * n);
    CHECK_OK(MIDDLE(fit_range)(&p, COUNT, q, qd, &w.fit_range));
    memset(&e, 0, sizeof e);
    CHECK_OK(MIDDLE(evidence_add)(&p, &b, &e, &w.evidence_add));
    for (i = 0; i <= 500; i++) {
        MIDDLE(state) x = {{0}, {0}};
        if (i < 500) T_(motion)(inner, 3 * i + 1, &seed, x.q, x.qd);
        CHECK_OK(MIDDLE(encode)(&p, &x, &s, &tick.encode));
        CHECK_OK(MIDDLE(doubt)(&p, &e, &s, &d, &tick.doubt));
        if (i < 500) most = fmax(most, (double)d.novelty);
    }
    CHECK(MIDDLE(in_range)(&p, &s));
    return (double)d.novelty / most;
}
#undef T__
#undef T_
