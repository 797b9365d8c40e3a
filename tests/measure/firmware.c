/* SPDX-License-Identifier: MIT */
/* firmware.c - what a model adds to firmware that controls and predicts, and with TRAIN learns: sizes.sh takes flash and RAM of
   this object file, and the stack of its functions. With FILTER, OBSERVE or DOUBT it calls that, too; with WORST it calls all three
   and can take the longest way (longest_way.h). */

#define ROLN_FLASH __attribute__((section(".rodata.weights")))
#ifdef WORST
static int longest(int rows);
#define ROLNI_EIG_SWEEPS longest
#endif
#include "firmware.h"
#ifdef WORST
#include "longest_way.h"
#endif
#define WEIGHTS_(m) STRING(m##_weights.h)
#define WEIGHTS(m) WEIGHTS_(m)
#include WEIGHTS(MODEL)

#define DT 0.001f /* s, from tick to tick */

__attribute__((section(".rodata.measure"))) const M(params) *const weights = &M(weights);
struct control control;
union scratch scratch;

#ifdef TRAIN
struct learner learner;
#define PARAMS (&learner.p)
#else
#define PARAMS (&M(weights))
#endif

#if defined FILTER || defined OBSERVE || defined DOUBT
struct estimates estimates;
#endif
#ifdef WORST
#define MEASURED estimates.y
#define GIVEN(name) (&estimates.name)
#else
#define MEASURED control.x.q
#define GIVEN(name) (&name)
#define CONST __attribute__((weak)) const /* weak: the compiler may not use its numbers */
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpedantic" /* [0 ... N - 1] */
#ifdef FILTER
extern const roln_noise noise;
CONST roln_noise noise = {.dt = DT, .q = 1e-3f, .tau = 0.1f, .gate = 5, .lost = 3};
#endif
#ifdef OBSERVE
extern const M(observer_gains) gains;
CONST ROLN_FLASH M(observer_gains) gains = {.dt = DT, .lost = 3, .q = {[0 ... N - 1] = 1e-3f}, .e = {[0 ... N - 1] = 2e-3f}};
#endif
#ifdef DOUBT
extern const M(evidence) known;
CONST ROLN_FLASH M(evidence) known = {.count = 1, .L = {[0 ... ROLN_TRI(M(terms)) - 1] = 1}};
#endif
#pragma GCC diagnostic pop
#endif

roln_status tick(void)
{
    static const roln_limits limits = { /* every check is made, with DOUBT that of novelty, too */
#ifdef DOUBT
        .evidence = GIVEN(known)->L, .novelty = 1e9f,
#endif
        .dt = DT, .margin = 0.1f, .residual = 1e9f, .tau = 1e9f, .hold = 5, .q_tolerance = 1e9f, .qd_tolerance = 1e9f};
    struct control *c = &control;
    return M(tick)(PARAMS, &limits, &c->x, &c->ref, &c->s, &c->guard, &scratch.control.tick) != 0 ? ROLN_E_RANGE : ROLN_OK;
}

roln_status ahead(void)
{
    return M(step)(PARAMS, &control.s, control.guard.tau, DT, &scratch.control.step);
}

#ifdef FILTER
roln_status filter(void)
{
    struct estimates *e = &estimates;
    M(filter_tick)(PARAMS, GIVEN(noise), MEASURED, control.guard.tau, &e->filter, &e->work);
    return e->filter.f.valid ? ROLN_OK : ROLN_E_RANGE;
}
#endif

#ifdef OBSERVE
roln_status observe(void)
{
    struct estimates *e = &estimates;
    M(observer_tick)(PARAMS, GIVEN(gains), MEASURED, control.guard.tau, &e->observer, &e->observing);
    return e->observer.f.valid ? ROLN_OK : ROLN_E_RANGE;
}
#endif

#if defined WORST || defined DOUBT
roln_status doubt(void)
{
    return M(doubt)(PARAMS, GIVEN(known), &control.s, &estimates.doubts, &scratch.control.doubt);
}
#endif

#ifdef TRAIN
roln_status train(void)
{
    static const roln_loss acceleration = ROLN_ACC_WEIGHTS, ode = ROLN_ODE_WEIGHTS;
    static const roln_opt rates = ROLN_OPT(0.001f, 0.001f);
    struct learner *l = &learner;
    const roln_batch sample = {.count = 1, .stride = 1, .q = l->q, .qd = l->qd, .qdd = l->qdd};
    const roln_batch window = {.count = 1, .steps = HORIZON, .stride = 1, .q = l->q, .qd = l->qd};
    roln_status st;
    memset(&l->gradient, 0, sizeof l->gradient);
    st = M(grad_acc)(&l->p, &acceleration, &sample, &l->gradient, &scratch.train.grad_acc);
    if (st == ROLN_OK) st = M(grad)(&l->p, &ode, &window, l->p.dt, &l->gradient, &scratch.train.grad);
    if (st == ROLN_OK) st = M(update)(&l->p, &rates, &l->optimiser, &l->gradient, &scratch.train.update);
    return st;
}
#endif
