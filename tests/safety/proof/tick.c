/* SPDX-License-Identifier: MIT */
/* tick.c - NAME_tick, a whole control tick, of any bits in parameters, measurement, reference, gains, latent state, guard and
   scratch: nothing undefined, and torques as in guard.c. A double pendulum with all checks; -DFURUTA, -DARM: the models of
   examples/furuta_tick.h and examples/arm_tick.h, with the limits that stand there; -DCHART: an autoencoder with a chart, and a
   limit of the residual that follows; -DKNOWN: evidence, any bits, in its place. */

#include "eva.h"

#if defined FURUTA
#include "furuta_tick.h"
#define NAME(x) furuta_##x
enum { COUNT = 1 };
static const float top[COUNT] = {TORQUE};
#elif defined ARM
#include "arm_tick.h"
#define NAME(x) arm_##x
#define top most
enum { COUNT = arm_N };
/* The guard of the arm has 3^6 ways to clip torques. There novelty is any number; proved of any state by itself: novelty_main. */
/*@ assigns t[0 .. arm_terms - 1], \result \from \nothing; */
static roln_real arm_i_novelty(const arm_params *p, const roln_real *L, const roln_real *z, const roln_real *zd, roln_real *t);
#elif defined CHART
#define ROLN_NAME chart
#define ROLN_AE 3, 2
#define ROLN_CHART polynomial, 2
#define ROLN_MLP 2
#include "roln.h"
#define NAME(x) chart_##x
enum { COUNT = 3 };
static const float top[COUNT] = {60, 0.5f, 8};
#ifdef KNOWN
static roln_real known[ROLN_TRI(chart_terms)];
static roln_limits limits = {.dt = 0.001f, .margin = 0.05f, .tau_each = top, .hold = 3, .q_tolerance = 0.05f, .qd_tolerance = 1,
                             .evidence = known};
#else
static const roln_limits limits = {.dt = 0.001f, .margin = 0.05f, .residual = 3, .tau_each = top, .hold = 3, .q_tolerance = 0.05f,
                                   .qd_tolerance = 1, .residual_window = 10, .false_alarms = 0.001f};
#endif
#else
#include "pend2.h"
#define NAME(x) pend2_##x
enum { COUNT = 2 };
static const float top[COUNT] = {60, 0.5f};
static const roln_limits limits = {.dt = 0.001f, .margin = 0.05f, .residual = 3, .tau_each = top, .hold = 3, .q_tolerance = 0.05f,
                                   .qd_tolerance = 1, .residual_window = 10};
#endif
static NAME(params) params;
static NAME(state) x;
static NAME(target) ref;
static NAME(latent) s;
static NAME(guard) guard;
static NAME(tick_work) work;

#ifdef ARM
int novelty_main(void)
{
    static roln_real t[arm_terms];
    EVA_ANY(params), EVA_ANY(s), EVA_ANY(t);
    arm_i_novelty(&params, limits.evidence, s.z, s.zd, t);
    /*@ assert ended: \true; */
    return 0;
}
#endif

int main(void)
{
    int i;
#ifdef KNOWN
    EVA_ANY(known), EVA_ANY(limits.novelty);
#endif
    EVA_ANY(params), EVA_ANY(x), EVA_ANY(ref), EVA_ANY(s), EVA_ANY(guard), EVA_ANY(work);
    NAME(tick)(&params, &limits, &x, &ref, &s, &guard, &work);
    for (i = 0; i < COUNT; i++)
        may_go_to_a_motor(guard.tau[i], top[i]);
    /*@ assert ended: \true; */
    return 0;
}
