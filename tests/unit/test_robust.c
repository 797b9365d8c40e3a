/* SPDX-License-Identifier: MIT */
/* Soft limits of plans (roln.h section 13): costs, gradients and curvatures against their definition in long double and against
   differences; limits that matter to no plan; plans that keep limits, tightened ones and reserves of torque; what limits are
   tightened by, against a sum over all errors; what is refused. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* An angle and a slider. */
#define ROLN_NAME cart
#define ROLN_AE 2
#define ROLN_ANGLES 1, 0
#define ROLN_MLP 6
#define ROLN_DAMPING 1
#define ROLN_PLAN 6, 2
#include "roln.h"

/* Three coordinates of five joints. */
#define ROLN_NAME limb
#define ROLN_AE 5, 3
#define ROLN_MLP 6
#define ROLN_DAMPING 1
#define ROLN_PLAN 6, 3
#include "roln.h"

typedef long double ld;
#define CHECK_OK(call) CHECK((call) == ROLN_OK)
#ifdef ROLN_DOUBLE
#define PICK(f32, f64) (f64)
#else
#define PICK(f32, f64) (f32)
#endif

void TEST_NAME(robust)(void);

/* The definition: what y costs under a weight of 1, for limits low and high, NULL or infinite: none; *slope its derivative, *bent
   the second one. y is judged where it is `ahead` of itself. */
static ld hinge(ld y, ld ahead, const roln_real *low, const roln_real *high, ld inside, ld *slope, ld *bent)
{
    const ld over = high && isfinite(*high) ? y - ((ld)*high - inside) : -1e9L;
    const ld under = low && isfinite(*low) ? (ld)*low + inside - y : -1e9L;
    const int is_over = over + ahead > 0, is_under = under - ahead > 0;
    *slope = 2 * ((is_over ? over : 0) - (is_under ? under : 0)), *bent = 2 * (is_over + is_under);
    return (is_over ? over * over : 0) + (is_under ? under * under : 0);
}

#define ROBUST(x) cart_##x
#include "robust.h"
#undef ROBUST
#define ROBUST(x) limb_##x
#include "robust.h"
#undef ROBUST

/* An angle costs alike on all turns, by its distance from the limit that is next to it. */
static void test_turns(void)
{
    static cart_params p;
    static cart_i_goal_work w;
    static const roln_real weight[2] = {1, 0}, low[2] = {-1, -1}, high[2] = {2, 1}, far[2] = {4, 1};
    roln_term term = {.of = ROLN_OF_Z, .weight = weight, .low = low, .high = high};
    roln_goal goal = {.terms = 1, .term = &term};
    int turn, i;
    cart_start_model(&p);
    for (turn = -1; turn <= 1; turn++)
        for (i = 0; i < 40; i++) {
            const ld full = 6.28318530717958647693L, at = -3 + 6.25L * i / 40, y = at < 0.5L - full / 2 ? at + full : at;
            const ld e = y > 2 ? y - 2 : y < -1 ? -1 - y : 0;
            const roln_real s[4] = {(roln_real)(at + turn * full), 5, 0, 0};
            roln_real cost = 0;
            term.high = high;
            CHECK_OK(cart_i_goal_at(&p, &goal, 0, s, &cost, NULL, NULL, &w));
            CHECK_NEAR(cost, e * e, 16 * (ld)ROLN_EPS * (1 + e * e));
            term.low = NULL, cost = 0; /* one side: half a turn beyond it */
            CHECK_OK(cart_i_goal_at(&p, &goal, 0, s, &cost, NULL, NULL, &w));
            CHECK_NEAR(cost, at > 2 ? (at - 2) * (at - 2) : at < 2 - full / 2 ? (at + full - 2) * (at + full - 2) : 0,
                       PICK(1e-5, 1e-13));
            term.low = low, term.high = far, cost = 0; /* 5 rad wide */
            CHECK_OK(cart_i_goal_at(&p, &goal, 0, s, &cost, NULL, NULL, &w));
            CHECK_NEAR(cost, at < -1 && at + full > 4 ? fminl((-1 - at) * (-1 - at), (at + full - 4) * (at + full - 4)) : 0,
                       PICK(1e-5, 1e-13));
        }
}

/* A plan that begins beyond one limit and ends beyond the other, whose curvatures are alike: it aims between reference and low, at
   -2.5; with high in place of low it would be -1.5. */
static void test_both_sides(void)
{
    static cart_params p;
    static cart_plan plan;
    static cart_plan_next_work w;
    const roln_real u[2] = {ROLN_C(1e-6), ROLN_C(1e-6)}, one[2] = {1, 1}, ref[2] = {-4, -4}, low[2] = {-1, -1}, high[2] = {1, 1};
    const roln_limits limits = {.dt = 1, .tau = ROLN_C(1e6), .margin = 100};
    const roln_term term[2] = {{.of = ROLN_OF_ZD, .weight = one, .ref = ref},
                               {.of = ROLN_OF_ZD, .weight = one, .low = low, .high = high}};
    const roln_goal goal = {.dt = ROLN_C(0.125), .terms = 2, .term = term, .u = u, .limits = &limits};
    const cart_latent s = {{0}, {4, 4}};
    cart_start_model(&p);
    p.z_min[0] = p.z_min[1] = -40, p.z_max[0] = p.z_max[1] = 40, p.zd_max[0] = p.zd_max[1] = 200;
    memset(&plan, 0, sizeof plan);
    CHECK_OK(cart_plan_next(&p, &goal, &s, &plan, &w));
    CHECK_BELOW(plan.s[1].zd[0], -1.75);
    CHECK_BELOW(plan.s[1].zd[1], -1.75);
}

/* Limits whose sum is beyond the largest number do not hold less. */
static void test_large_limits(void)
{
    static cart_params p;
    static cart_i_goal_work w;
    const roln_real most = (roln_real)(sizeof(roln_real) > 4 ? 1.6e308 : 3e38);
    const roln_real s[4] = {0, 0, 0, 0}, one[2] = {1, 1}, low[2] = {-1, most / 2}, high[2] = {1, most};
    const roln_term term = {.of = ROLN_OF_Z, .weight = one, .low = low, .high = high};
    const roln_goal goal = {.terms = 1, .term = &term};
    roln_real cost = 0;
    cart_start_model(&p);
    CHECK(cart_i_goal_at(&p, &goal, 0, s, &cost, NULL, NULL, &w) != ROLN_OK || cost > 1);
}

/* Whatever bits the torque before has, that of a step is within the motor's limits: a torque far beyond them, of both signs, from
   which the limit of rate alone would lead to another torque beyond them. */
static void test_any_bits(void)
{
    static cart_plan_next_work w;
    static const roln_real rate[2] = {1, 1};
    const roln_limits limits = {.rate_each = rate};
    const roln_goal goal = {.limits = &limits};
    int j, k;
    for (j = 0; j < 2; j++)
        w.top[j] = 2, w.rate[j] = ROLN_C(0.25), w.last[j] = 2;
    for (j = 0; j < 2; j++)
        for (k = -4; k <= 4; k++) {
            const roln_real want = k > 2 ? 2 : k < -2 ? -2 : (roln_real)k - (k > 0 ? ROLN_C(0.25) : k < 0 ? ROLN_C(-0.25) : 0);
            CHECK(cart_i_plan_clip(&goal, &w, 0, j, (roln_real)k, 0) == want);
        }
}

void TEST_NAME(robust)(void)
{
    cart_test_robust();
    limb_test_robust();
    test_turns();
    test_both_sides();
    test_large_limits();
    test_any_bits();
}
