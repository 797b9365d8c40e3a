/* SPDX-License-Identifier: MIT */
/* fuzz_model.h - one model of fuzz_calls.c: every generated function, called with numbers of every kind, and what roln.h says of it
   claimed behind each call: a failure leaves the outputs as they were, ROLN_OK leaves finite ones, and the rest of its contract.

   Included once for each model, behind MODEL, its name, and its options of roln.h. SIBLING: with ROLN_QUANTISE, the model of full
   weights that was included before. Afterwards MODEL##_start_of (a fresh model) and MODEL##_call (the next call) are
   there. */

#define JOIN_(a, b) a##_##b
#define JOIN(a, b) JOIN_(a, b)
#define M(name) JOIN(MODEL, name)
#ifdef ROLN_PLAN
#define HAS_PLAN
#endif
#ifdef ROLN_CHART
#define HAS_CHART
#endif
#ifdef ROLN_FRICTION
#define HAS_FRICTION
#if ROLN_FRICTION > 1
#define HAS_LAW
#endif
#endif
#ifdef ROLN_LOAD
#define HAS_LOAD
#endif
#ifdef ROLN_QUANTISE
#define HAS_STORE
#else
#define ROLN_GN_ROWS 6
#define HAS_STORE_NOT
#endif
#define ROLN_NAME MODEL
#define ROLN_HORIZON 3
#include "roln.h"

enum { M(side2) = 2 * M(n), M(nu) = M(force_size) };

/* What lives from call to call; in lim, limits and where they point. */
static M(params) M(p);
static M(latent) M(s);
static M(state) M(x);
static M(target) M(r);
static M(guard) M(g);
static M(filter) M(f);
static M(work) M(w);
static struct {
    roln_limits l;
    roln_motors motors;
    roln_real tau[M(N)], rate[M(N)], safe[M(N)], B[M(N) * M(N)];
    M(evidence) known;
} M(lim);
static M(observer) M(ob);
#ifdef HAS_PLAN
static M(plan) M(pl);
#endif
#ifdef HAS_STORE_NOT
static M(gradient) M(gr);
static M(optimiser) M(o);
static M(residuals) M(rs);
static M(newton) M(nt);
#ifdef HAS_CHART
static M(chart) M(c), M(more);
static M(refinement) M(turned);
#endif
#endif

#if defined HAS_CHART && defined HAS_STORE_NOT
static void M(fresh_chart)(void)
{
    memset(&M(c), 0, sizeof M(c)), memset(&M(more), 0, sizeof M(more)), memset(&M(turned), 0, sizeof M(turned));
}
#endif

/* All of it but scratch anew, so that an input does the same behind any other. */
static void M(fresh)(void)
{
    memset(&M(s), 0, sizeof M(s)), memset(&M(x), 0, sizeof M(x)), memset(&M(r), 0, sizeof M(r));
    memset(&M(g), 0, sizeof M(g)), memset(&M(f), 0, sizeof M(f)), memset(&M(lim), 0, sizeof M(lim));
#ifdef HAS_PLAN
    memset(&M(pl), 0, sizeof M(pl));
#endif
#ifdef HAS_STORE_NOT
    memset(&M(gr), 0, sizeof M(gr)), memset(&M(o), 0, sizeof M(o));
    memset(&M(rs), 0, sizeof M(rs)), memset(&M(nt), 0, sizeof M(nt));
#ifdef HAS_CHART
    M(fresh_chart)();
#endif
#endif
}

#ifdef HAS_STORE
static void M(random)(uint64_t *seed)
{
#define FULL JOIN(SIBLING, packed_size)
    static unsigned char bytes[FULL];
    static M(start) work;
    static M(params) made[4]; /* storing takes as long as a hundred calls */
    const int which = roln_randint(4, seed);
    M(params) *p = made + which;
    if (p->slope == 0) {
        uint64_t own = (uint64_t)which; /* not that of the input which comes first */
        JOIN(SIBLING, random)(&own);
        JOIN(SIBLING, pack)(&JOIN(SIBLING, p), bytes);
        CLAIM(M(quantise)(FULL, bytes, p, &work.quantise) == ROLN_OK);
    }
    memcpy(&M(p), p, sizeof *p);
#undef FULL
}
#else
static void M(random)(uint64_t *seed)
{
    static M(start) work;
    int i;
    CLAIM(M(init)(&M(p), seed, &work.init) == ROLN_OK);
    M(p).dt = ROLN_C(0.01);
    for (i = 0; i < M(n); i++)
        M(p).z_min[i] = -2, M(p).z_max[i] = 2, M(p).zd_max[i] = 20;
}
#endif

/* A model: as it is after NAME_init, with a few numbers of any kind, with networks that are too steep, or all of any kind. */
static void M(start_of)(int kind)
{
    const int from = kind == 3 ? 0 : kind == 4 ? 2 : M(numbers) - M(theta_size);
    roln_real *p = (roln_real *)(void *)&M(p);
    int i;
    M(fresh)();
    M(random)(&fuzz_now.seed);
    if (kind == 1)
        for (i = 1 + fuzz_below(3); i > 0; i--)
            p[fuzz_below(M(numbers))] = fuzz_kind(fuzz_below(8), &fuzz_now.seed);
    if (kind == 2)
        for (i = from + M(ae_size); i < M(numbers); i++)
            p[i] *= 30 * fuzz_kind(0, &fuzz_now.seed);
    if (kind >= 3)
        for (i = from; i < M(numbers); i++)
            p[i] = fuzz_real();
}

/* ---- prediction and mechanics ---- */

static void M(call_joints)(int which)
{
    struct { roln_real tau_z[M(n)]; } force;
    struct { roln_real tau[M(N)]; } full;
    roln_real in[3 * M(N)];
    M(state) x = M(x);
    roln_status st;
    fuzz_reals(3 * M(N), in), memset(&force, 0, sizeof force), memset(&full, 0, sizeof full);
    switch (which) {
    case 0: fuzz_keep(&M(s), sizeof M(s)), fuzz_judge(M(encode)(&M(p), &M(x), &M(s), &M(w).encode), &M(s), sizeof M(s)); break;
    case 1: fuzz_keep(&x, sizeof x), fuzz_judge(M(decode)(&M(p), &M(s), &x, &M(w).decode), &x, sizeof x); break;
    case 2:
        fuzz_keep(M(r).z, 3 * M(n) * sizeof(roln_real));
        fuzz_judge(M(encode_reference)(&M(p), in, in + M(N), in + 2 * M(N), &M(r), &M(w).encode_reference), M(r).z,
                   3 * M(n) * sizeof(roln_real));
        break;
    case 3:
        fuzz_keep(&force, sizeof force);
        fuzz_judge(M(reduce)(&M(p), &M(s), in, force.tau_z, &M(w).reduce), &force, sizeof force);
        break;
    case 4:
        fuzz_keep(&full, sizeof full), fuzz_judge(M(lift)(&M(p), &M(s), in, full.tau, &M(w).lift), &full, sizeof full);
        break;
    default:
        fuzz_keep(&full, sizeof full), st = M(inertia)(&M(p), &M(s), in, full.tau, &M(w).inertia);
        fuzz_judge(st, &full, sizeof full);
        break;
    }
}

/* A symmetric matrix is positive semi-definite to rounding errors. */
static void M(claim_positive)(int n, const roln_real *A)
{
    double L[36], top = 0;
    int i, j, k;
    CLAIM(n <= 6);
    for (i = 0; i < n * n; i++)
        top = fabs((double)A[i]) > top ? fabs((double)A[i]) : top;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double sum = (double)A[i * n + j];
            CLAIM(fabs(sum - (double)A[j * n + i]) <= 16 * n * (double)ROLN_EPS * top);
            if (i == j) sum += 64 * n * (double)ROLN_EPS * top + 1e-36;
            for (k = 0; k < j; k++)
                sum -= L[i * n + k] * L[j * n + k];
            if (i == j) CLAIM(sum > 0);
            L[i * n + j] = i == j ? sqrt(sum) : sum / L[j * n + j];
        }
}

static void M(call_mechanics)(int which)
{
    M(equation) e;
    M(latent) s = M(s);
    struct { M(jacobian) j; M(latent) s; } linear;
    struct { roln_real tau_z[M(n)]; } force;
    static M(linear_work) linwork;
    roln_real in[M(N) + 2 * M(n)];
    const roln_real *tau = fuzz_below(4) ? in : NULL, dt = fuzz_below(4) ? ROLN_C(0.01) : fuzz_real();
    roln_status st;
    fuzz_reals(M(N) + 2 * M(n), in), memset(&e, 0, sizeof e), memset(&linear, 0, sizeof linear), memset(&force, 0, sizeof force);
    FUZZ_SPOIL(&linwork, sizeof linwork);
    switch (which) {
    case 0: fuzz_keep(&s, sizeof s), fuzz_judge(M(step)(&M(p), &s, tau, dt, &M(w).step), &s, sizeof s), M(s) = s; break;
    case 1:
        linear.s = s, fuzz_keep(&linear, sizeof linear);
        fuzz_judge(M(linear)(&M(p), &linear.s, tau, dt, &linear.j, &linwork), &linear, sizeof linear);
        break;
    case 2:
        fuzz_keep(&force, sizeof force);
        fuzz_judge(M(inverse)(&M(p), &s, tau ? in + M(n) : NULL, in, force.tau_z, &M(w).inverse), &force, sizeof force);
        break;
    default:
        fuzz_keep(&e, sizeof e), st = M(dynamics)(&M(p), &s, &e, &M(w).dynamics), fuzz_judge(st, &e, sizeof e);
        if (st == ROLN_OK && M(p).scale.m > 0) {
            M(claim_positive)(M(n), e.M);
            CLAIM(e.T >= 0);
        }
        break;
    }
}

static void M(call_small)(int which)
{
    roln_check c = {0, 0, 0, 0};
    const int in = M(in_range)(&M(p), &M(s));
    fuzz_call();
    CLAIM(!in || (roln_all_finite(2 * M(n), M(s).z) && !M(params_mismatch)(&M(p))));
    if (which > 0) {
        fuzz_call();
        CLAIM(M(check)(&M(p), fuzz_below(2 * M(numbers)) - 1, &c) != ROLN_E_CHECKSUM);
    }
#ifdef HAS_FRICTION
    {
        struct { roln_real c[M(n)], v[M(n)]; } dry = {{0}, {0}};
        fuzz_keep(&dry, sizeof dry), fuzz_judge(M(friction_of)(&M(p), dry.c, dry.v), &dry, sizeof dry);
    }
#endif
#ifdef HAS_LAW
    {
        roln_friction law[M(n)] = {{0, 0, 0, 0, 0, 0}};
        fuzz_keep(law, sizeof law), fuzz_judge(M(friction_law)(&M(p), law), law, sizeof law);
    }
#endif
}

/* ---- control ---- */

/* Evidence whose novelty is a number, or any. */
static void M(known_of)(void)
{
    M(evidence) *e = &M(lim).known;
    const int any = !fuzz_below(4);
    for (int i = 0, k = 0; i < M(terms); k += ++i) {
        fuzz_reals(i + 1, e->L + k);
        if (!any) e->L[k + i] = 1;
    }
    e->count = fuzz_below(4) ? 10 : fuzz_real(), e->halves = fuzz_below(8) - 1;
    fuzz_positives(2 * M(n), e->always), fuzz_positives(2 * M(n), e->grows), e->lasts = fuzz_positive();
}

static void M(limits_of)(void)
{
    const int any = fuzz_below(16), count = 1 + fuzz_below(M(N));
    roln_limits *l = &M(lim).l;
    fuzz_reals(M(N), M(lim).safe), fuzz_reals(M(N) * M(N), M(lim).B);
    fuzz_positives(M(N), M(lim).tau), fuzz_positives(M(N), M(lim).rate);
    memset(l, 0, sizeof *l);
    l->dt = any ? ROLN_C(0.01) : fuzz_real();
    l->margin = fuzz_below(2) ? 100 : fuzz_positive(), l->tau = fuzz_below(4) ? 5 : fuzz_positive();
    l->residual = fuzz_below(2) ? 0 : fuzz_positive(), l->rate = fuzz_below(2) ? 0 : fuzz_positive();
    l->q_tolerance = fuzz_below(2) ? 0 : fuzz_positive(), l->qd_tolerance = fuzz_below(2) ? 0 : fuzz_positive();
    l->hold = fuzz_below(8) ? fuzz_below(4) : -1, l->residual_window = fuzz_below(4), l->strict = fuzz_below(2);
    l->tau_each = fuzz_below(4) ? NULL : M(lim).tau, l->rate_each = fuzz_below(4) ? NULL : M(lim).rate;
    l->safe = fuzz_below(2) ? NULL : M(lim).safe;
    M(lim).motors.mu = fuzz_below(4) ? ROLN_C(0.01) : fuzz_real();
    M(lim).motors.count = fuzz_below(16) ? count : M(N) + 1 - 2 * count, M(lim).motors.B = M(inputs) > 0 ? NULL : M(lim).B;
    l->motors = fuzz_below(4) ? NULL : &M(lim).motors;
    l->false_alarms = fuzz_below(4) ? 0 : fuzz_below(4) ? ROLN_C(0.01) : fuzz_real();
    l->novelty = fuzz_below(4) ? ROLN_C(1e6) : fuzz_real(), l->evidence = fuzz_below(4) ? NULL : M(lim).known.L;
    if (!fuzz_below(8)) M(known_of)();
}

/* The torques of a guard behind a tick, `was` before it: finite, and within the limits or 0; held, safe, or changed at the rate. */
static void M(claim_guard)(uint32_t faults, const M(guard) *was)
{
    const roln_limits *l = &M(lim).l;
    const roln_motors *f = l->motors;
    const int fit = M(model).actuator != ROLN_SERVO, own = fit && f && f->B && f->count >= 1 && f->count <= M(N);
    const int counted = !f || own || (fit && !f->B && M(inputs) > 0);
    const int nu = own ? f->count : M(nu), good = (faults & ~(uint32_t)ROLN_CLIPPED) == 0;
    int i;
    CLAIM((M(g).g.faults & (was->g.faults | faults)) == (was->g.faults | faults));
    CLAIM(!(was->g.faults & ROLN_FAULT_EXPIRED) || (faults & ROLN_FAULT_EXPIRED));
    CLAIM((roln_all_finite(M(N), M(x).q) && roln_all_finite(M(N), M(x).qd)) || (faults & ROLN_FAULT_INPUT));
    CLAIM(good || !(faults & ROLN_CLIPPED));
    CLAIM(good || (was->g.bad >= 0 && was->g.bad < l->hold) || (faults & ROLN_FAULT_EXPIRED));
    CLAIM(counted || (faults & ROLN_FAULT_INPUT));
    CLAIM(!good || l->false_alarms == 0 || (l->false_alarms > 0 && l->false_alarms < 1 && l->residual > 0));
    CLAIM(!good || !l->evidence || l->novelty >= 0);
    for (i = 0; i < nu; i++) {
        const roln_real top = !l->tau_each ? l->tau : counted ? l->tau_each[i] : 0, rate = l->rate_each ? l->rate_each[i] : l->rate;
        const roln_real tau = M(g).tau[i], at = was->tau[i], last = roln_finite(at) && ROLN_ABS(at) <= top ? at : 0;
        const double far = (double)rate * (double)l->dt * 1.000001 + 1e-6 * fabs((double)last) + 1e-37;
        CLAIM(roln_finite(tau) && (ROLN_ABS(tau) <= top || tau == 0));
        if (good) CLAIM(roln_finite(top) && top >= 0 && roln_finite(l->dt) && l->dt > 0 && roln_finite(rate) && rate >= 0);
        if (good && rate > 0) CLAIM(fabs((double)tau - (double)last) <= far);
        if (!good && !(faults & ROLN_FAULT_EXPIRED)) CLAIM(tau == last);
        if (faults & ROLN_FAULT_EXPIRED && !l->safe) CLAIM(tau == 0);
    }
}

static void M(call_guard)(int which)
{
    const M(guard) was = M(g);
    roln_real want[M(N)];
    uint32_t faults;
    fuzz_reals(M(N), want);
    fuzz_keep(&M(s), sizeof M(s)), fuzz_call();
    if (which == 0) {
        faults = M(tick)(&M(p), &M(lim).l, &M(x), &M(r), &M(s), &M(g), &M(w).tick);
        CLAIM(fuzz_kept(&M(s), sizeof M(s)) || roln_all_finite(2 * M(n), M(s).z));
        CLAIM(M(g).g.allocation_residual >= 0 && M(g).g.allocation_residual <= 1);
    } else {
        faults = M(guard_tick)(&M(p), &M(lim).l, &M(x), fuzz_below(8) ? &M(s) : NULL, fuzz_below(8) ? want : NULL, &M(g),
                               &M(w).guard_tick);
        CLAIM(fuzz_kept(&M(s), sizeof M(s)));
    }
    CLAIM(faults & ROLN_FAULT_STATUS || !M(params_mismatch)(&M(p)));
    M(claim_guard)(faults, &was);
}

static void M(call_control)(int which)
{
    struct { roln_real tau_z[M(n)]; } force;
    struct { roln_real u[M(N)], missed; } motors;
    roln_real K[2 * M(N)], in[M(n)];
    roln_status st;
    memset(&force, 0, sizeof force), memset(&motors, 0, sizeof motors);
    fuzz_reals(M(n), in), fuzz_positives(2 * M(N), K);
    switch (which) {
    case 0:
        fuzz_keep(&force, sizeof force);
        fuzz_judge(M(control)(&M(p), &M(s), &M(r), force.tau_z, &M(w).control), &force, sizeof force);
        break;
    case 1:
        fuzz_keep(M(r).kp, 2 * M(n) * sizeof(roln_real));
        fuzz_judge(M(gains)(&M(p), &M(s), K, K + M(N), &M(r), &M(w).gains), M(r).kp, 2 * M(n) * sizeof(roln_real));
        break;
    default:
        if (M(lim).motors.count > M(N)) return; /* u has no more room */
        fuzz_keep(&motors, sizeof motors);
        st = M(allocate)(&M(p), &M(s), M(lim).l.motors, in, motors.u, &motors.missed, &M(w).allocate);
        fuzz_judge(st, &motors, sizeof motors);
        CLAIM(motors.missed >= 0 && motors.missed <= 1);
        break;
    }
}

/* What a target is, a state, a measurement. */
static void M(call_given)(int which)
{
    if (which == 0) fuzz_reals(2 * M(n), M(s).z);
    else if (which == 1) fuzz_reals(2 * M(N), M(x).q);
    else if (which == 2) fuzz_reals(3 * M(n), M(r).z), fuzz_positives(2 * M(n), M(r).kp);
    else if (which == 3) {
        fuzz_reals(M(nu), M(g).tau), M(g).g.energy = fuzz_real(), M(g).g.power = fuzz_real(), M(g).g.residual = fuzz_real();
        M(g).g.bad = fuzz_below(8) - 2, M(g).g.valid = fuzz_below(2), M(g).g.faults = (uint32_t)fuzz_below(1024);
        M(g).g.sum = fuzz_real(), M(g).g.raised = fuzz_real(), M(g).g.ticks = fuzz_below(8) - 1;
        M(g).g.since = (uint32_t)fuzz_below(8) - 1, M(g).g.alarms = (uint32_t)fuzz_below(8) - 1;
    }
    else if (which == 4) memset(&M(g), 0, sizeof M(g));
    else M(limits_of)();
#ifdef HAS_LOAD
    M(r).load = fuzz_below(2) ? M(f).load : NULL;
#endif
}

/* ---- feedback, plans, estimates ---- */

static void M(call_lqr)(int which)
{
    static union { M(lqr_work) lqr; M(lqr_along_work) lqr_along; } work;
    struct { roln_real K[2 * M(N) * M(side2)], P[M(side2) * M(side2)]; } o;
    M(latent) s[3];
    roln_real in[4 * M(N)], u[2 * M(N)], P[M(side2) * M(side2)];
    roln_cost cost;
    roln_status st;
    int i;
    if (M(lim).motors.count > M(N)) return;
    memset(&o, 0, sizeof o), fuzz_positives(4 * M(N), in), fuzz_reals(2 * M(N), u);
    cost.q = in, cost.qd = in + M(N), cost.u = in + 2 * M(N), cost.dt = fuzz_below(4) ? ROLN_C(0.01) : fuzz_real();
    cost.motors = M(lim).l.motors;
    for (i = 0; i < 3; i++)
        s[i] = M(s);
    fuzz_reals(M(side2), s[2].z);
    for (i = 0; i < M(side2) * M(side2); i++)
        P[i] = i % (M(side2) + 1) == 0 ? fuzz_positive() : 0;
    FUZZ_SPOIL(&work, sizeof work);
    fuzz_keep(&o, sizeof o);
    if (which == 0) {
        st = M(lqr)(&M(p), &cost, s, fuzz_below(2) ? u : NULL, o.K, fuzz_below(4) ? o.P : NULL, &work.lqr);
        fuzz_judge(st, &o, sizeof o);
        M(claim_positive)(M(side2), o.P);
    } else {
        fuzz_call(), i = fuzz_below(8) ? 2 : 0;
        st = M(lqr_along)(&M(p), &cost, i, s, fuzz_below(2) ? u : NULL, fuzz_below(2) ? P : NULL, o.K, &work.lqr_along);
        CLAIM(roln_all_finite(2 * M(N) * M(side2), o.K)); /* those that were computed before it failed are written */
        CLAIM(st == ROLN_OK || i > 0 || fuzz_kept(&o, sizeof o));
    }
}

static void M(call_filter)(int which)
{
    static M(filter_tick_work) work;
    roln_real in[4 * M(N)], *y = in, *tau = in + M(N);
    roln_noise noise;
    uint32_t faults;
    int i;
    if (which == 1) memset(&M(f), 0, sizeof M(f));
    fuzz_reals(2 * M(N), in), fuzz_positives(2 * M(N), in + 2 * M(N));
    memset(&noise, 0, sizeof noise);
    noise.dt = fuzz_below(8) ? ROLN_C(0.01) : fuzz_positive(), noise.q = fuzz_below(4) ? ROLN_C(0.001) : fuzz_positive();
    noise.tau = fuzz_below(4) ? 1 : fuzz_positive(), noise.gate = fuzz_below(2) ? 0 : fuzz_positive(), noise.lost = fuzz_below(3);
    noise.load = fuzz_below(2) ? ROLN_C(0.1) : fuzz_positive();
    noise.q_each = fuzz_below(8) ? NULL : in + 2 * M(N), noise.tau_each = fuzz_below(8) ? NULL : in + 3 * M(N);
    for (i = 0; i < M(N); i++)
        if (!fuzz_below(8)) y[i] = (roln_real)NAN;
    FUZZ_SPOIL(&work, sizeof work);
    fuzz_call();
    faults = M(filter_tick)(&M(p), &noise, fuzz_below(8) ? y : NULL, fuzz_below(4) ? tau : NULL, &M(f), &work);
    CLAIM(roln_all_finite(M(side2), M(f).s.z) && roln_all_finite(M(filtered) * M(filtered), M(f).F) && roln_finite(M(f).f.nis));
    CLAIM((faults & ROLN_FAULT_STATUS) || !M(params_mismatch)(&M(p)));
    CLAIM((M(f).f.faults & faults) == faults);
    CLAIM(!(faults & ROLN_FILTER_START) || (M(f).f.valid && M(f).f.starts > 0));
#ifdef HAS_LOAD
    CLAIM(roln_all_finite(M(n), M(f).load));
#endif
}

static void M(call_observer)(int which)
{
    static M(observer_tick_work) work;
    static M(observer_gains) gains;
    roln_real y[M(N)], tau[M(N)];
    uint32_t faults;
    int i;
    if (which == 1) memset(&M(ob), 0, sizeof M(ob));
    fuzz_reals(M(N), y), fuzz_reals(M(N), tau), fuzz_positives(M(N), gains.q), fuzz_positives(M(N), gains.e);
    gains.dt = fuzz_below(8) ? ROLN_C(0.01) : fuzz_positive(), gains.gate = fuzz_below(2) ? 0 : fuzz_positive();
    gains.lost = fuzz_below(3), gains.settle = fuzz_below(2) ? 20 : fuzz_positive();
    fuzz_reals(M(centres) * M(n), gains.z[0]), fuzz_reals(4 * M(centres) * M(n) * M(n), gains.P[0][0]);
    for (i = 0; i < M(N); i++)
        if (!fuzz_below(8)) y[i] = (roln_real)NAN;
    FUZZ_SPOIL(&work, sizeof work);
    fuzz_call();
    faults = M(observer_tick)(&M(p), &gains, fuzz_below(8) ? y : NULL, fuzz_below(4) ? tau : NULL, &M(ob), &work);
    CLAIM(roln_all_finite(M(side2), M(ob).s.z) && roln_finite(M(ob).f.nis));
    CLAIM((faults & ROLN_FAULT_STATUS) || !M(params_mismatch)(&M(p)));
    CLAIM((M(ob).f.faults & faults) == faults);
    CLAIM(!(faults & ROLN_FILTER_START) || (M(ob).f.valid && M(ob).f.starts > 0));
}

static void M(call_doubt)(void)
{
    static M(doubt_work) work;
    M(doubts) d;
    memset(&d, 0, sizeof d);
    if (fuzz_below(2)) M(known_of)();
    FUZZ_SPOIL(&work, sizeof work);
    fuzz_keep(&d, sizeof d);
    fuzz_judge(M(doubt)(&M(p), &M(lim).known, &M(s), &d, &work), &d, sizeof d);
}

#ifdef HAS_PLAN

/* Torques of a plan: within their limits, and from one to the next within the rate; states are finite, and in range. */
static void M(claim_plan)(const roln_goal *g)
{
    const roln_limits *l = g->limits;
    int k, j;
    CLAIM(roln_all_finite((M(steps) + 1) * M(side2), M(pl).s[0].z) && roln_all_finite(M(steps) * M(motors) * M(side2), M(pl).K));
    CLAIM(roln_finite(M(pl).plan.cost) && roln_finite(M(pl).plan.duality_gap) && M(pl).plan.valid && M(pl).plan.age == 0);
    for (k = 0; k < M(steps); k++)
        for (j = 0; j < M(motors); j++) {
            const double top = (double)(l->tau_each ? l->tau_each[j] : l->tau), u = (double)M(pl).u[k * M(motors) + j];
            const double rate = (double)(l->rate_each ? l->rate_each[j] : l->rate) * (double)g->dt;
            CLAIM(fabs(u) <= top);
            if (k > 0 && rate > 0)
                CLAIM(fabs(u - (double)M(pl).u[(k - 1) * M(motors) + j]) <= rate * (1 + 1e-6) + 4 * (double)ROLN_EPS * top + 1e-36);
        }
}

static void M(call_plan)(int which)
{
    static union { M(plan_next_work) next; M(plan_linear_work) linear; M(plan_tighten_work) tighten; } work;
    static roln_real A[M(steps) * M(side2) * M(side2)], B[M(steps) * M(side2) * M(motors)], c[M(steps) * M(side2)];
    roln_real in[5 * M(N)], u[M(motors)], P[M(side2) * M(side2)];
    static roln_real low[M(N)], high[M(N)], inside[M(steps) * M(N)], reserve[M(steps) * M(motors)];
    const int z = fuzz_below(2);
    roln_term term;
    roln_goal goal;
    roln_status st;
    int i;
    if (M(motors) != (M(lim).l.motors ? M(lim).motors.count : M(nu)) && M(lim).motors.B) /* mostly motors of the plan's number */
        M(lim).l.motors = &M(lim).motors, M(lim).motors.count = fuzz_below(16) ? M(motors) : M(lim).motors.count;
    memset(&goal, 0, sizeof goal), memset(&term, 0, sizeof term), memset(u, 0, sizeof u);
    term.of = 2 * z + fuzz_below(2), term.count = M(n), term.weight = in, term.ref = in + M(N);
    term.last = fuzz_below(2) ? 10 : fuzz_real();
    fuzz_positives(5 * M(N), in), fuzz_reals(M(N), in + M(N));
    for (i = 0; i < M(side2) * M(side2); i++)
        P[i] = i % (M(side2) + 1) == 0 ? fuzz_positive() : 0;
    goal.dt = fuzz_below(8) ? ROLN_C(0.02) : fuzz_real(), goal.terms = fuzz_below(2), goal.term = &term, goal.u = in + 2 * M(N);
    goal.hold = fuzz_below(2) ? NULL : in + 3 * M(N), goal.limits = &M(lim).l;
    goal.iterations = fuzz_below(4) ? 0 : fuzz_below(67) - 1;
    if (fuzz_below(2)) { /* a soft limit, tightened */
        fuzz_reals(M(N), low), fuzz_positives(M(N), high), fuzz_positives(M(steps) * M(N), inside);
        for (i = 0; i < M(N); i++)
            high[i] += low[i];
        term.low = fuzz_below(4) ? low : NULL, term.high = fuzz_below(4) ? high : NULL;
        term.tighten = fuzz_below(2) ? inside : NULL;
    }
    if (!fuzz_below(4)) fuzz_positives(M(steps) * M(motors), reserve), goal.reserve = reserve;
    goal.P = fuzz_below(2) ? NULL : P, goal.end = M(r).z, goal.load = fuzz_below(2) ? NULL : in + 4 * M(N);
    FUZZ_SPOIL(&work, sizeof work);
    fuzz_call();
    if (which == 0) {
        fuzz_keep(M(pl).s, sizeof M(pl) - offsetof(M(plan), s));
        st = M(plan_next)(&M(p), &goal, &M(s), &M(pl), &work.next);
        if (st == ROLN_OK) M(claim_plan)(&goal);
        else CLAIM(fuzz_kept(M(pl).s, sizeof M(pl) - offsetof(M(plan), s)) && M(pl).plan.age >= 0 && M(pl).plan.age < M(steps));
    } else if (which == 1) {
        fuzz_keep(u, sizeof u);
        st = M(plan_follow)(&M(p), &goal, &M(pl), fuzz_below(2) ? (roln_real)fuzz_below(8) * ROLN_C(0.005) : fuzz_real(), &M(s), u);
        CLAIM(st == ROLN_OK ? roln_all_finite(M(motors), u) : fuzz_kept(u, sizeof u));
        for (i = 0; i < M(motors) && st == ROLN_OK; i++)
            CLAIM(ROLN_ABS(u[i]) <= (M(lim).l.tau_each ? M(lim).l.tau_each[i] : M(lim).l.tau));
    } else if (which == 2) {
        st = M(plan_linear)(&M(p), &goal, &M(pl), A, B, c, &work.linear);
        if (st == ROLN_OK) CLAIM(roln_all_finite(M(steps) * M(side2) * M(side2), A));
        if (st == ROLN_OK) CLAIM(roln_all_finite(M(steps) * M(side2) * M(motors), B) && roln_all_finite(M(steps) * M(side2), c));
    } else if (fuzz_below(2)) {
        if (fuzz_below(2)) M(known_of)();
        const roln_term *of = fuzz_below(2) ? &term : NULL;
        roln_real *to = of ? inside : reserve;
        st = M(plan_tighten)(&M(p), &M(lim).known, &goal, &M(pl), of, fuzz_below(2) ? 3 : fuzz_real(), to, &work.tighten);
        for (i = 0; st == ROLN_OK && i < M(steps) * (!of ? M(motors) : z ? M(n) : M(N)); i++)
            CLAIM(to[i] >= 0 && roln_finite(to[i]));
    } else memset(&M(pl), 0, sizeof M(pl));
}
#endif

/* ---- training ---- */

enum { M(samples) = 32 };
typedef struct {
    roln_real q[M(samples) * M(N)], qd[M(samples) * M(N)], qdd[M(samples) * M(N)], tau[M(samples) * M(N)];
} M(motion);
static M(motion) M(data), M(smooth);
static const int M(starts)[4] = {0, 3, 7, 1};

/* Windows of motion: smooth, about as fast as a machine, with a few numbers of any kind. */
static roln_batch M(batch_of)(void)
{
    roln_batch b;
    int i, k;
    for (i = 0; i < M(samples) * M(N) && M(smooth).tau[0] == 0; i++) {
        const double t = 0.05 * (i / M(N)) + i % M(N);
        M(data).q[i] = (roln_real)(sin(t) / 2), M(data).qd[i] = (roln_real)(cos(t) / 2);
        M(data).qdd[i] = (roln_real)(-sin(t) / 2), M(data).tau[i] = (roln_real)cos(3 * t);
    }
    if (M(smooth).tau[0] == 0) M(smooth) = M(data);
    M(data) = M(smooth);
    for (k = fuzz_now.odd & 3 ? fuzz_below(4) : 0; k > 0; k--)
        ((roln_real *)&M(data))[fuzz_below(4 * M(samples) * M(N))] = fuzz_real();
    b.count = fuzz_below(16) ? 1 + fuzz_below(4) : fuzz_below(2) - 1, b.steps = fuzz_below(16) ? fuzz_below(4) : -1;
    b.stride = fuzz_below(16) ? 1 + fuzz_below(2) : 0, b.start = fuzz_below(2) ? M(starts) : NULL;
    b.q = M(data).q, b.qd = fuzz_below(4) ? M(data).qd : NULL, b.qdd = fuzz_below(4) ? M(data).qdd : NULL;
    b.tau = fuzz_below(2) ? M(data).tau : NULL;
    return b;
}

static M(train) M(t);

/* What the model does not know: ahead, and from recordings. */
static void M(call_known)(int which)
{
    static M(doubt_ahead_work) work;
    struct { M(latent) s; M(outlook) o; } x;
    const roln_batch b = M(batch_of)();
    const roln_real dt = fuzz_below(8) ? ROLN_C(0.01) : fuzz_real();
    M(evidence) *e = &M(lim).known;
    const size_t made = sizeof *e - offsetof(M(evidence), halves);
    const int fresh = which == 1 && fuzz_below(2);
    roln_status st;
    if (fuzz_below(2)) M(known_of)();
    if (fresh) memset(e, 0, sizeof *e);
    FUZZ_SPOIL(&work, sizeof work);
    if (which == 0) {
        memset(&x.o, 0, sizeof x.o), x.s = M(s);
        if (!fuzz_below(4)) fuzz_reals(4 * M(n) * M(n), x.o.P), fuzz_reals(2 * M(n) * M(n), x.o.C);
        fuzz_keep(&x, sizeof x);
        fuzz_judge(M(doubt_ahead)(&M(p), e, &x.s, fuzz_below(2) ? M(data).tau : NULL, dt, &x.o, &work), &x, sizeof x);
    } else if (which == 1) {
        fuzz_call(), st = M(evidence_add)(&M(p), &b, e, &M(t).evidence_add);
        CLAIM(st != ROLN_OK || !fresh || (e->count > 1 && roln_all_finite(ROLN_TRI(M(terms)), e->L)));
    } else {
        fuzz_keep(&e->halves, made), fuzz_call();
        st = which == 2 ? M(fit_doubt)(&M(p), &b, dt, e, &M(t).fit_doubt) : M(fit_outlook)(&M(p), &b, dt, e, &M(t).fit_outlook);
        CLAIM(st == ROLN_OK ? (which == 2 ? e->lasts <= 0 : e->lasts > 0) && roln_finite(e->lasts) : fuzz_kept(&e->halves, made));
        CLAIM(st != ROLN_OK || which == 3 || roln_all_finite(4 * M(n), e->always));
    }
}

/* Range, limits, noise, errors: of stored models, too. */
static void M(call_fit)(int which)
{
    roln_batch b = M(batch_of)();
    struct { roln_error e[5], joints[5 * M(N)]; } o;
    struct { roln_real tau[M(nu)], rate[M(nu)]; } each = {{0}, {0}};
    roln_real qbar[M(N)] = {0}, q_each[M(N)] = {0}, *range = M(p).z_min;
    roln_limits l;
    roln_noise noise;
    roln_status st;
    memset(&o, 0, sizeof o), memset(&l, 0, sizeof l), memset(&noise, 0, sizeof noise);
    l.dt = noise.dt = fuzz_below(4) ? ROLN_C(0.01) : fuzz_real(), l.hold = 3, l.tau = 1;
    if (which == 0) {
        fuzz_keep(range, 3 * M(n) * sizeof *range), st = M(fit_range)(&M(p), b.count, b.q, M(data).qd, &M(t).fit_range);
        fuzz_judge(st, range, 3 * M(n) * sizeof *range);
        for (b.count = 0; b.count < M(n) && st == ROLN_OK; b.count++)
            CLAIM(M(p).z_min[b.count] <= M(p).z_max[b.count] && M(p).zd_max[b.count] >= 0);
    } else if (which == 1) {
        roln_limits was;
        if (fuzz_below(2)) M(known_of)(), l.evidence = M(lim).known.L;
        if (fuzz_below(2)) l.false_alarms = fuzz_below(4) ? ROLN_C(0.1) : fuzz_real();
        was = l;
        fuzz_keep(&each, sizeof each);
        st = M(fit_limits)(&M(p), &b, fuzz_below(4) ? 2 : fuzz_real(), &l, each.tau, each.rate, &M(t).fit_limits);
        fuzz_judge(st, &each, sizeof each);
        {
            const roln_real made[6] = {l.margin, l.residual, l.q_tolerance, l.qd_tolerance, l.tau, l.rate};
            CLAIM(st == ROLN_OK || memcmp(&l, &was, sizeof l) == 0);
            for (b.count = 0; b.count < 6 && st == ROLN_OK; b.count++)
                CLAIM(made[b.count] >= 0 && roln_finite(made[b.count]));
        }
    } else if (which == 2 && fuzz_below(64) == 0) { /* hundreds of ticks of a filter */
        noise.q = fuzz_below(2) ? ROLN_C(0.01) : 0;
        b.steps = b.steps > 0 ? b.steps + 3 : b.steps, b.count = b.count > 2 ? 2 : b.count;
        fuzz_keep(q_each, sizeof q_each), st = M(fit_noise)(&M(p), &b, &noise, q_each, NULL, &M(t).fit_noise);
        fuzz_judge(st, q_each, sizeof q_each);
        CLAIM(roln_finite(noise.tau) && noise.tau >= 0 && (st == ROLN_OK || noise.tau == 0));
    } else {
        fuzz_call(), st = M(errors)(&M(p), &b, l.dt, fuzz_below(4), qbar, &(roln_errors){o.e, o.joints, NULL}, &M(t).errors);
        CLAIM(st != ROLN_OK || (rolni_errors_finite(5, o.e) && rolni_errors_finite(5 * M(N), o.joints)));
    }
}

#ifdef HAS_STORE_NOT

static void M(call_train)(int which)
{
    const roln_opt opt = {{ROLN_C(0.01), ROLN_C(0.01), ROLN_C(0.01)}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0,
                          fuzz_below(2) ? 0 : fuzz_positive()};
    static const roln_loss weights[3] = {ROLN_ODE_WEIGHTS, ROLN_ACC_WEIGHTS, ROLN_POSITION_WEIGHTS};
    const roln_loss *wt = weights + fuzz_below(3);
    const roln_batch b = M(batch_of)();
    const roln_real dt = fuzz_below(4) ? ROLN_C(0.01) : fuzz_real();
    static M(start) start;
    static struct { M(params) p; roln_real qbar[M(N)]; } pod;
    roln_loss var;
    roln_real forces[M(n)];
    roln_status st;
    switch (which) {
    case 0:
        memset(&var, 0, sizeof var), fuzz_keep(&var, sizeof var);
        fuzz_judge(M(variance)(&M(p), &b, &var, &M(t).variance), &var, sizeof var);
        break;
    case 1:
        fuzz_keep(&M(p), sizeof M(p)), fuzz_call(), st = M(fit_inertia)(&M(p), &b, &M(t).fit_inertia);
        CLAIM(st == ROLN_OK ? roln_finite(M(p).scale.m) && M(p).scale.m > 0 : fuzz_kept(&M(p), sizeof M(p)));
        memset(&forces, 0, sizeof forces), fuzz_keep(&forces, sizeof forces);
        fuzz_judge(M(force_variance)(&M(p), &b, forces, &M(t).force_variance), &forces, sizeof forces);
        break;
    case 2: /* a gradient that is not finite is not looked for, the update refuses it; a block of windows that fails adds nothing */
        fuzz_keep(&M(gr), sizeof M(gr)), fuzz_call(), st = M(grad)(&M(p), wt, &b, dt, &M(gr), &M(t).grad);
        CLAIM(st == ROLN_OK || fuzz_kept(&M(gr), sizeof M(gr)));
        break;
    case 3:
        fuzz_keep(&M(gr), sizeof M(gr)), fuzz_call(), st = M(grad_acc)(&M(p), wt, &b, &M(gr), &M(t).grad_acc);
        CLAIM(st == ROLN_OK || fuzz_kept(&M(gr), sizeof M(gr)));
        break;
    case 4:
        fuzz_keep(M(p).theta, sizeof M(p).theta), st = M(update)(&M(p), &opt, &M(o), &M(gr), &M(t).update);
        fuzz_judge(st, M(p).theta, sizeof M(p).theta);
        if (st == ROLN_OK) CLAIM(roln_all_finite(M(theta_size) + 2 * M(moment_size), M(o).m));
        break;
    case 5: memset(&M(gr), 0, sizeof M(gr)), memset(&M(o), 0, sizeof M(o)); break;
    default:
        fuzz_call(), st = M(init_pod)(&pod.p, b.count, b.q, M(data).qd, pod.qbar, &fuzz_now.seed, &start.init_pod);
        if (st == ROLN_OK)
            CLAIM(roln_all_finite(M(numbers), (const roln_real *)(const void *)&pod.p) && !M(params_mismatch)(&pod.p));
        break;
    }
}

static void M(call_newton)(int which)
{
    static const roln_newton begin = ROLN_NEWTON_START;
    static const roln_loss weights[2] = {ROLN_ODE_WEIGHTS, ROLN_ACC_WEIGHTS};
    static roln_real sums[ROLN_SYM_WORK];
    const roln_newton_opt opt = {fuzz_below(2) ? 1 : 10, 1, fuzz_below(2) ? 0 : 3, NULL};
    const roln_batch b = M(batch_of)();
    const int count = fuzz_below(16) ? 4 : fuzz_below(10) - 1;
    roln_status st;
    fuzz_call();
    if (which == 0) {
        memset(&M(nt), 0, sizeof M(nt)), memset(&M(rs), 0, sizeof M(rs));
        M(nt).state = begin, M(rs).seed = fuzz_now.seed;
    } else if (which == 1) {
        M(rows)(&M(p), weights + fuzz_below(2), &b, ROLN_C(0.01), fuzz_below(8) - 1, 0, &M(rs), &M(t).rows);
    } else if (which == 2) { /* a step from rows to its end */
        st = M(newton_rows)(&M(p), &opt, count, &M(rs), &M(nt));
        if (st != ROLN_OK) return;
        M(newton_normal_equations)(&opt, count, 0, ROLN_NEWTON_SIDE(count, M(newton_size)), &M(rs), &M(nt), sums);
        st = M(newton_step)(&M(p), &opt, count, &M(rs), &M(nt));
        CLAIM(st != ROLN_OK || roln_all_finite(M(newton_size), M(nt).next.theta + M(newton_from)));
        if (st == ROLN_OK) M(rows)(&M(nt).next, weights, &b, ROLN_C(0.01), 0, 1, &M(rs), &M(t).rows);
        fuzz_keep(&M(p), sizeof M(p));
        if (st == ROLN_OK && !M(newton_accept)(&M(p), count, count, &M(rs), &M(nt))) CLAIM(fuzz_kept(&M(p), sizeof M(p)));
    } else {
        fuzz_reals((int)(sizeof M(rs).r / sizeof(roln_real)), M(rs).r);
        fuzz_reals((int)(sizeof M(rs).J / sizeof(roln_real)), M(rs).J);
    }
}
#endif

#if defined HAS_CHART && defined HAS_STORE_NOT
static void M(call_chart)(int which)
{
    static M(start) start;
    const roln_batch b = M(batch_of)();
    const int finite = roln_all_finite(M(numbers), (const roln_real *)(const void *)&M(p));
    roln_real residual = 0;
    roln_status st = ROLN_OK;
    fuzz_call();
    fuzz_keep(&M(p), sizeof M(p));
    if (which == 0) st = M(chart_add)(&M(p), b.count < 0 ? 0 : M(samples), b.q, &M(c), &start.chart_add);
    else if (which == 1) M(chart_merge)(&M(c), &M(more));
    else if (which == 2) M(fresh_chart)();
    else if (which == 3) st = M(chart_center)(&M(p));
    else if (which == 4)
        st = M(chart_solve)(&M(p), fuzz_below(2) ? &M(c) : &M(more), fuzz_below(2) ? ROLN_CHART_RIDGE : fuzz_real(), &residual,
                            &start.chart_solve);
    else st = M(chart_refine)(&M(p), &b, &M(turned), &residual);
    CLAIM(roln_finite(residual));
    if (st != ROLN_OK || which < 3) CLAIM(fuzz_kept(&M(p), sizeof M(p)));
    else CLAIM(!finite || roln_all_finite(M(numbers), (const roln_real *)(const void *)&M(p)));
}
#endif

/* ---- keeping it ---- */

static void M(count_text)(void *ctx, const char *text)
{
    *(size_t *)ctx += strlen(text);
}

static void M(call_keep)(int which)
{
    static unsigned char bytes[M(packed_size)];
    static M(params) back;
    size_t length = 0;
    roln_status st;
    fuzz_call();
    if (which == 0) {
        st = M(write)(&M(p), M(count_text), &length);
        CLAIM(st == ROLN_OK ? length > 1000 : length == 0);
    } else {
        memset(&back, 0, sizeof back), fuzz_keep(&back, sizeof back);
        M(pack)(&M(p), bytes), st = M(unpack)(M(packed_size), bytes, &back);
        CLAIM(st == ROLN_OK ? memcmp(&back, &M(p), sizeof back) == 0 : fuzz_kept(&back, sizeof back));
        CLAIM(st != ROLN_OK || !M(params_mismatch)(&back));
    }
}

/* The next call, which a byte names; its numbers are odd as another one says. */
static void M(call)(unsigned byte)
{
    const int which = (int)(byte >> 4);
    FUZZ_SPOIL(&M(w), sizeof M(w));
    if ((byte & 15) > 11) FUZZ_SPOIL(&M(t), sizeof M(t));
    switch (byte & 15) {
    case 0: case 1: M(call_given)(which % 6); break;
    case 2: M(call_joints)(which % 6); break;
    case 3: case 4: M(call_mechanics)(which % 4); break;
    case 5: case 6: M(call_guard)(which % 2); break;
    case 7: M(call_control)(which % 3); break;
    case 8: M(call_small)(which % 2); break;
    case 9: M(call_lqr)(which % 2); break;
    case 10:
        if (which < 8) M(call_filter)(which == 0);
        else if (which < 14) M(call_observer)(which == 8);
        else M(call_doubt)();
        break;
#ifdef HAS_PLAN
    case 11: M(call_plan)(which % 4); break;
#endif
    case 12:
        if (which < 8) M(call_fit)(which % 4);
        else M(call_known)(which % 4);
        break;
#ifdef HAS_STORE_NOT
    case 13: M(call_train)(which % 7); break;
    case 14: M(call_newton)(which % 4); break;
#endif
#if defined HAS_CHART && defined HAS_STORE_NOT
    case 15: M(call_chart)(which % 6); break;
#endif
    default: M(call_keep)(which % 2); break;
    }
}

#undef MODEL
#undef SIBLING
#undef HAS_PLAN
#undef HAS_CHART
#undef HAS_FRICTION
#undef HAS_LAW
#undef HAS_LOAD
#undef HAS_STORE
#undef HAS_STORE_NOT
