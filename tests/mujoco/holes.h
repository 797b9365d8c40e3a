/* SPDX-License-Identifier: MIT */
/* holes.h - included behind the tick of a machine and M(x), NAME_x. States anywhere in the box that the machine's limits let pass:
   its guard refuses those whose novelty is beyond limits.novelty, and no other. The same guard without evidence refuses none. */

static int is_refused(const roln_limits *by, const M(state) *x, const M(latent) *s)
{
    static const roln_real none[M(N)];
    static M(work) work;
    static M(guard) guard;
    memset(&guard.g, 0, sizeof guard.g);
    return (M(guard_tick)(&M(weights), by, x, s, none, &guard, &work.guard_tick) & ROLN_FAULT_RANGE) != 0;
}

static void test_holes(void)
{
    enum { COUNT = 2000 };
    static M(doubt_work) doubtwork;
    static M(work) work;
    const M(params) *const p = &M(weights);
    roln_limits box = limits;
    uint64_t seed = 1;
    int novel = 0, k, i;
    box.evidence = NULL;
    for (k = 0; k < COUNT; k++) {
        M(latent) s;
        M(state) x;
        M(doubts) doubts;
        for (i = 0; i < M(n); i++) {
            const roln_real at = (1 + 2 * limits.margin) * roln_uniform(&seed) - limits.margin;
            s.z[i] = p->z_min[i] + at * (p->z_max[i] - p->z_min[i]);
            s.zd[i] = (2 * roln_uniform(&seed) - 1) * (1 + limits.margin) * p->zd_max[i];
        }
        CHECK(M(decode)(p, &s, &x, &work.decode) == ROLN_OK);
        doubts.novelty = 0;
        CHECK(M(doubt)(p, &M(known), &s, &doubts, &doubtwork) == ROLN_OK);
        novel += doubts.novelty > limits.novelty;
        CHECK(is_refused(&limits, &x, &s) == (doubts.novelty > limits.novelty));
        CHECK(!is_refused(&box, &x, &s));
    }
    CHECK(novel > 0 && novel < COUNT);
}
