/* SPDX-License-Identifier: MIT */
/* rig.h - everything that a guard reads, in one struct, and a tick of it. Include after small.h. */
#ifndef RIG_H
#define RIG_H
#include "control.h"

ROLN_FN int within(int n, const roln_real *x, roln_real top)
{
    int i, ok = 1;
    for (i = 0; i < n; i++)
        ok &= roln_finite(x[i]) && ROLN_ABS(x[i]) <= top;
    return ok;
}

/* What failed on the way to the guard: nothing, the controller (want NULL), the encoder (z NULL too). */
enum { NOTHING, CONTROLLER, ENCODER, WAYS_TO_FAIL };

/* Everything a guard reads. */
typedef struct {
    roln_real q[MAXN], qd[MAXN], z[MAXN], zd[MAXN], z_min[MAXN], z_max[MAXN], zd_max[MAXN], want[MAXN], held[MAXN];
    roln_limits limits;
    roln_guard g;
    int failed;
} rig;

/* The numbers of two guards, which may differ in the padding between them. */
ROLN_FN int same_guard(const roln_guard *a, const roln_guard *b)
{
    return a->faults == b->faults && a->bad == b->bad && a->valid == b->valid && same(1, &a->energy, &b->energy) &&
           same(1, &a->power, &b->power) && same(1, &a->residual, &b->residual) &&
           same(1, &a->allocation_residual, &b->allocation_residual) && same(1, &a->sum, &b->sum) &&
           same(1, &a->raised, &b->raised) && a->ticks == b->ticks && a->since == b->since && a->alarms == b->alarms;
}

ROLN_FN instance of_rig(int k, const rig *x)
{
    const instance m = {models[k], scale_of(k), x->z_min, x->z_max, x->zd_max, theta_k, NULL};
    return m;
}

ROLN_FN uint32_t tick(int k, rig *x)
{
    const instance m = of_rig(k, x);
    const guard_at held = {&x->g, x->held};
    const uint32_t before = x->g.faults;
    const int blind = x->failed == ENCODER;
    const uint32_t f = m.of->guard_tick(&m, &x->limits, x->q, x->qd, blind ? NULL : x->z, blind ? NULL : x->zd,
                                        x->failed ? NULL : x->want, &held, ROOM(guard_tick));
    ROOM_KEPT();
    CHECK(x->g.faults == (before | f) && f < 512); /* sticky, nothing else */
    CHECK(!(f & ROLN_FAULT_EXPIRED) || x->limits.safe || all(1, x->held, 0));
    return f;
}

/* A state in range, at a velocity that leaves the energy residual far below the limit, and a guard two good ticks old. */
ROLN_FN void good(int k, rig *x)
{
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k);
    uint64_t s = 300 + (uint64_t)k;
    memset(x, 0, sizeof *x);
    parameters(k, &s, theta_k);
    dyadic(N, 1, &s, x->q), dyadic(N, 1, &s, x->qd);
    dyadic(n, ROLN_C(0.5), &s, x->z), dyadic(n, ROLN_C(0.015625), &s, x->zd), dyadic(F, 1, &s, x->want);
    fill(n, -1, x->z_min), fill(n, 1, x->z_max), fill(n, 2, x->zd_max);
    x->limits.dt = ROLN_C(0.0625), x->limits.margin = ROLN_C(0.25), x->limits.residual = 4;
    x->limits.tau = ROLN_C(1.5), x->limits.hold = 3, x->limits.strict = 1;
    CHECK(tick(k, x) == 0 && same(F, x->held, x->want) && tick(k, x) == 0);
    CHECK(x->g.bad == 0 && x->g.valid == 1 && x->g.faults == 0);
}

ROLN_FN uint32_t one_call(int k, rig *x, const target_at *ref)
{
    const instance m = of_rig(k, x);
    const guard_at held = {&x->g, x->held};
    const uint32_t f = m.of->tick(&m, &x->limits, x->q, x->qd, ref, x->z, x->zd, &held, ROOM(tick));
    ROOM_KEPT();
    return f;
}

/* A coordinate that is no angle. */
ROLN_FN int bounded(int k)
{
    return roln_lnn_angle(&models[k]->md->lnn, 0) ? 1 : 0;
}

#endif
