/* SPDX-License-Identifier: MIT */
/* What a model does not know: novelty against its definition in long double, holes in what was seen, deviations and times that were
   put into recordings, covariances against those of a larger system, the guard. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

/* Two joints that are their own coordinates. */
#define ROLN_NAME plain
#define ROLN_AE 2
#define ROLN_MLP 8
#include "roln.h"

/* An angle and a slider, in units of their own. */
#define ROLN_NAME cart
#define ROLN_AE 2
#define ROLN_SCALE each
#define ROLN_MLP 8
#define ROLN_ANGLES 1, 0
#include "roln.h"

/* Three coordinates behind a chart. */
#define ROLN_NAME sheet
#define ROLN_AE 5, 3
#define ROLN_MLP 8
#define ROLN_CHART polynomial, 2
#include "roln.h"

/* One coordinate; and too many for squares. */
#define ROLN_NAME bead
#define ROLN_AE 1
#define ROLN_MLP 4
#include "roln.h"

#define ROLN_NAME centipede
#define ROLN_AE 9
#define ROLN_MLP 4
#include "roln.h"

/* Four coordinates, more degrees of one number than of their products; and the most coordinates that have squares. */
#define ROLN_NAME dog
#define ROLN_AE 4
#define ROLN_MLP 4
#include "roln.h"

#define ROLN_NAME octopus
#define ROLN_AE 8
#define ROLN_MLP 4
#include "roln.h"

typedef long double ld;
#define CHECK_OK(call) CHECK((call) == ROLN_OK)

void TEST_NAME(doubt)(void);

/* Solves A x = b [m][m] by Gauss with pivots, x to b. */
static void solve(int m, ld *A, ld *b)
{
    int i, j, k;
    for (k = 0; k < m; k++) {
        int top = k;
        for (i = k + 1; i < m; i++)
            if (fabsl(A[i * m + k]) > fabsl(A[top * m + k])) top = i;
        for (j = 0; j < m; j++) {
            const ld a = A[k * m + j];
            A[k * m + j] = A[top * m + j], A[top * m + j] = a;
        }
        {
            const ld a = b[k];
            b[k] = b[top], b[top] = a;
        }
        for (i = k + 1; i < m; i++) {
            const ld f = A[i * m + k] / A[k * m + k];
            for (j = k; j < m; j++)
                A[i * m + j] -= f * A[k * m + j];
            b[i] -= f * b[k];
        }
    }
    for (k = m - 1; k >= 0; k--) {
        for (j = k + 1; j < m; j++)
            b[k] -= A[k * m + j] * b[j];
        b[k] /= A[k * m + k];
    }
}

/* T_k(x) on [-1, 1] and beyond, by its definition. */
static ld chebyshev(int k, ld x)
{
    if (fabsl(x) <= 1) return cosl((ld)k * acosl(x));
    return (x > 0 || k % 2 == 0 ? 1 : -1) * coshl((ld)k * acoshl(fabsl(x)));
}

/* All products of Chebyshev polynomials of x [count] of total degree up to `degree`, but 1, in any order. Returns how many. */
static int products(int count, const ld *x, int degree, ld so_far, int any, ld *to)
{
    int k, made = 0;
    if (count == 0) {
        if (any) *to = so_far;
        return any;
    }
    for (k = 0; k <= degree; k++)
        made += products(count - 1, x + 1, degree - k, so_far * chebyshev(k, x[0]), any || k > 0, to + made);
    return made;
}

#define DOUBTED(x) plain_##x
#include "doubted.h"
#undef DOUBTED
#define DOUBTED(x) cart_##x
#include "doubted.h"
#undef DOUBTED
#define DOUBTED(x) sheet_##x
#include "doubted.h"
#undef DOUBTED
#define DOUBTED(x) bead_##x
#include "doubted.h"
#undef DOUBTED
#define DOUBTED(x) centipede_##x
#include "doubted.h"
#undef DOUBTED
#define DOUBTED(x) dog_##x
#include "doubted.h"
#undef DOUBTED

#define MIDDLE(x) plain_##x
#include "middle.h"
#undef MIDDLE
#define MIDDLE(x) dog_##x
#include "middle.h"
#undef MIDDLE
#define MIDDLE(x) octopus_##x
#include "middle.h"
#undef MIDDLE

/* limits.novelty is four times the largest of the motion. Beyond it is the middle of a closed curve, of up to eight coordinates; of
   two coordinates also that of motion in all directions, which stays six tenths of the way away from it. */
static void test_middle(void)
{
    CHECK_BELOW(4, dog_test_middle(0));
    CHECK_BELOW(4, octopus_test_middle(0));
    CHECK_BELOW(4, plain_test_middle(0.6));
}

/* Motion on a ring: its middle is in the box of what was seen, but was never seen. limits.novelty tells, limits.margin does not. */
static void test_ring(void)
{
    enum { COUNT = 720 };
    static roln_real q[2 * COUNT], qd[2 * COUNT];
    static plain_params p;
    static plain_evidence e;
    static plain_train w;
    static plain_work tick;
    static plain_guard guard;
    const roln_batch b = {1, COUNT - 1, 1, NULL, q, qd, NULL, NULL};
    roln_limits limits = {.dt = ROLN_C(0.001), .margin = ROLN_C(0.1), .tau = 1};
    const roln_real zero[2] = {0, 0};
    plain_state x;
    plain_latent s;
    plain_doubts d;
    roln_real most = 0;
    int i;
    plain_model_of(&p);
    for (i = 0; i < COUNT; i++) { /* an ellipse, once around and a half */
        const double a = 9.42477796 * i / COUNT;
        q[2 * i] = (roln_real)(0.8 * cos(a)), q[2 * i + 1] = (roln_real)(0.5 * sin(a));
        qd[2 * i] = (roln_real)(-0.8 * sin(a)), qd[2 * i + 1] = (roln_real)(0.5 * cos(a));
    }
    CHECK_OK(plain_fit_range(&p, COUNT, q, qd, &w.fit_range));
    memset(&e, 0, sizeof e);
    CHECK_OK(plain_evidence_add(&p, &b, &e, &w.evidence_add));
    for (i = 0; i < COUNT; i += 7) {
        memcpy(x.q, q + 2 * i, sizeof x.q), memcpy(x.qd, qd + 2 * i, sizeof x.qd);
        CHECK_OK(plain_encode(&p, &x, &s, &tick.encode));
        CHECK_OK(plain_doubt(&p, &e, &s, &d, &tick.doubt));
        most = ROLN_MAX(most, d.novelty);
    }
    CHECK_BELOW(most, 4);
    memset(&x, 0, sizeof x);
    CHECK_OK(plain_encode(&p, &x, &s, &tick.encode));
    CHECK_OK(plain_doubt(&p, &e, &s, &d, &tick.doubt));
    CHECK(plain_in_range(&p, &s));
    CHECK_BELOW(10 * most, d.novelty);
    CHECK(plain_guard_tick(&p, &limits, &x, &s, zero, &guard, &tick.guard_tick) == 0);
    limits.evidence = e.L, limits.novelty = 2 * most;
    memset(&guard, 0, sizeof guard);
    CHECK(plain_guard_tick(&p, &limits, &x, &s, zero, &guard, &tick.guard_tick) == ROLN_FAULT_RANGE + ROLN_FAULT_EXPIRED);
    for (i = 0; i < COUNT; i++) {
        memset(&guard, 0, sizeof guard);
        memcpy(x.q, q + 2 * i, sizeof x.q), memcpy(x.qd, qd + 2 * i, sizeof x.qd);
        CHECK_OK(plain_encode(&p, &x, &s, &tick.encode));
        CHECK(plain_guard_tick(&p, &limits, &x, &s, zero, &guard, &tick.guard_tick) == 0);
    }
    limits.novelty = -1;
    memset(&guard, 0, sizeof guard);
    CHECK(plain_guard_tick(&p, &limits, &x, &s, zero, &guard, &tick.guard_tick) & ROLN_FAULT_INPUT);
    limits.novelty = ROLN_C(1e30);
    for (i = 0; i < 2 * plain_terms; i++) { /* a damaged number of the evidence lets no state pass */
        roln_real *const at = e.L + ROLN_TRI(i / 2) + i / 2, was = *at;
        *at = i % 2 ? (roln_real)NAN : (roln_real)INFINITY;
        memset(&guard, 0, sizeof guard);
        CHECK(plain_guard_tick(&p, &limits, &x, &s, zero, &guard, &tick.guard_tick) & ROLN_FAULT_RANGE);
        *at = was;
    }
}

/* Variables of a state that is not in any range: novelty is NaN or infinite, and no limit lets it pass. */
static void test_far(void)
{
    roln_real L[3] = {1, 0, 1}, t[2];
    t[0] = 1, t[1] = 1;
    CHECK_NEAR(rolni_novelty(2, L, t), 1, 0);
    t[0] = 1, t[1] = (roln_real)INFINITY;
    CHECK(!(rolni_novelty(2, L, t) <= ROLN_C(1e30)));
    t[0] = 1, t[1] = (roln_real)NAN;
    CHECK(!(rolni_novelty(2, L, t) <= ROLN_C(1e30)));
}

/* A state far outside of the range, such as a slip of an encoder leaves, is refused, also as the first one. Nothing is changed.
   One at its margin may be added, and novelty of the others stays. */
static void test_slip(void)
{
    enum { COUNT = 4000 };
    static const roln_real slip[5] = {20, -10000, ROLN_C(1e21), -ROLN_C(1e30), ROLN_C(2.5)};
    static roln_real q[2 * COUNT], qd[2 * COUNT];
    static plain_params p;
    static plain_evidence e, kept;
    static plain_train w;
    static plain_work tick;
    roln_batch b = {1, COUNT - 1, 1, NULL, q, qd, NULL, NULL};
    plain_state x = {{ROLN_C(0.1), 0}, {0, 0}};
    plain_latent s;
    plain_doubts d;
    roln_real before;
    int i, first;
    plain_model_of(&p);
    p.scale.q = 1;
    for (i = 0; i < COUNT; i++) {
        const double a = 0.02 * i;
        q[2 * i] = (roln_real)sin(a), q[2 * i + 1] = (roln_real)sin(1.414 * a);
        qd[2 * i] = (roln_real)cos(a), qd[2 * i + 1] = (roln_real)(1.414 * cos(1.414 * a));
    }
    CHECK_OK(plain_fit_range(&p, COUNT, q, qd, &w.fit_range));
    memset(&e, 0, sizeof e);
    for (first = 1; first >= 0; first--) {
        if (!first) CHECK_OK(plain_evidence_add(&p, &b, &e, &w.evidence_add));
        for (i = 0; i < 5; i++) {
            roln_real far[2] = {slip[i], 0}, still[2] = {0, 0};
            const roln_batch one = {1, 0, 1, NULL, far, still, NULL, NULL}, fast = {1, 0, 1, NULL, still, far, NULL, NULL};
            kept = e;
            CHECK(plain_evidence_add(&p, &one, &e, &w.evidence_add) == ROLN_E_RANGE && memcmp(&e, &kept, sizeof e) == 0);
            CHECK(plain_evidence_add(&p, &fast, &e, &w.evidence_add) == ROLN_E_RANGE && memcmp(&e, &kept, sizeof e) == 0);
            CHECK_OK(plain_encode(&p, &x, &s, &tick.encode));
            CHECK(plain_doubt(&p, &e, &s, &d, &tick.doubt) == (first ? ROLN_E_RANGE : ROLN_OK));
        }
    }
    before = d.novelty;
    for (i = 0; i < 20; i++) { /* novelty of others falls, or grows by one state in all of them at most */
        roln_real edge[2] = {ROLN_C(1.9), ROLN_C(-1.9)}, fast[2] = {ROLN_C(1.4), ROLN_C(1.4)};
        const roln_batch one = {1, 0, 1, NULL, edge, fast, NULL, NULL};
        CHECK_OK(plain_evidence_add(&p, &one, &e, &w.evidence_add));
    }
    CHECK_OK(plain_doubt(&p, &e, &s, &d, &tick.doubt));
    CHECK_BELOW(d.novelty, before * (1 + ROLN_C(0.01)));
    CHECK_BELOW(before * ROLN_C(0.9), d.novelty);
}

/* A range near the largest number: terms of a state in it overflow, and it is refused. */
static void test_overflow(void)
{
    static plain_params p;
    static plain_evidence e, kept;
    static plain_train w;
    roln_real most = 1, far[2] = {0, 0}, still[2] = {0, 0};
    const roln_batch one = {1, 0, 1, NULL, far, still, NULL, NULL};
    int i;
    plain_model_of(&p);
    p.scale.q = 1;
    while (roln_finite(2 * most))
        most *= 2;
    far[0] = ROLN_C(1.25) * most;
    for (i = 0; i < 2; i++)
        p.z_min[i] = 0, p.z_max[i] = ROLN_C(1.5) * most, p.zd_max[i] = 1;
    memset(&e, 0, sizeof e);
    kept = e;
    CHECK(plain_evidence_add(&p, &one, &e, &w.evidence_add) == ROLN_E_NOT_FINITE && memcmp(&e, &kept, sizeof e) == 0);
}

/* A machine at rest for a long time: the state that evidence begins with is not forgotten, and no state near rest is new. */
static void test_rest(void)
{
    static bead_params p;
    static bead_evidence e;
    static bead_train w;
    static bead_work tick;
    roln_real q = ROLN_C(0.25), qd = 0;
    const roln_batch b = {1, 0, 1, NULL, &q, &qd, NULL, NULL};
    bead_state x = {{ROLN_C(0.25)}, {0}};
    bead_latent s;
    bead_doubts d;
    int i, k;
    bead_model_of(&p);
    memset(&e, 0, sizeof e);
    CHECK_OK(bead_encode(&p, &x, &s, &tick.encode));
    s.zd[0] = ROLN_C(0.01); /* of a range of 3 */
    for (k = 0; k < 12; k++) {
        for (i = 0; i < 131072; i++)
            CHECK_OK(bead_evidence_add(&p, &b, &e, &w.evidence_add));
        if (sizeof(roln_real) > 4) e.count = ROLNI_AVERAGED; /* as if they had been so many */
        CHECK_OK(bead_doubt(&p, &e, &s, &d, &tick.doubt));
        CHECK_BELOW(d.novelty, 2);
    }
}

/* Laws of deviations that recordings ask for do not depend on the units of acceleration and force; a number that is always 0 says
   nothing. */
static void test_units_of_laws(void)
{
    static const double unit[8] = {1, 1e-24, 1e-18, 1e-12, 1e-6, 1e6, 1e12, 0};
    enum { COUNT = 2000 };
    int u, k, halves = 0;
    for (u = 0; u < 8; u++) {
        rolni_growths logs, squares[2];
        roln_real always[2], grows[2];
        uint64_t seed = 19;
        int found;
        memset(logs, 0, sizeof logs), memset(squares, 0, sizeof squares);
        for (k = 0; k < COUNT; k++) {
            const roln_real novelty = ROLN_C(0.1) + 8 * roln_uniform(&seed);
            const double deviation = sqrt(0.09 + 0.64 * pow((double)novelty, 2.5));
            roln_real error[2];
            error[0] = (roln_real)deviation * roln_normal(&seed);
            error[1] = (roln_real)(unit[u] * deviation) * roln_normal(&seed);
            rolni_growth_add(2, novelty, error, logs, squares);
        }
        found = rolni_growth_solve(COUNT, 2, logs, squares, always, grows);
        if (u == 0) halves = found;
        CHECK(found == halves && halves == 5);
        CHECK_NEAR(grows[0], 0.8, 0.1);
        CHECK_NEAR(grows[1], unit[u] * 0.8, unit[u] * 0.1);
    }
}

/* Errors that grow with the square of a novelty of which one is huge: the law is theirs. */
static void test_huge_novelty(void)
{
    static const roln_real novelty[5] = {1, 10, 1000, ROLN_C(1e6), ROLN_C(1e10)};
    rolni_growths logs, squares[1];
    roln_real always[1], grows[1];
    int k;
    memset(logs, 0, sizeof logs), memset(squares, 0, sizeof squares);
    for (k = 0; k < 5; k++) {
        const roln_real error[1] = {ROLN_C(1e-7) * novelty[k] * novelty[k]};
        rolni_growth_add(1, novelty[k], error, logs, squares);
    }
    CHECK(rolni_growth_solve(5, 1, logs, squares, always, grows) == 8);
    CHECK_NEAR(grows[0], 1e-7L, 1e-9L);
    CHECK(rolni_growth_log(HUGE_VAL) > 1e30);
    CHECK(rolni_growth_log(0) < -1e30);
    CHECK_NEAR(rolni_growth_log(1e300), 690.77552789821L, 1e-4L);
    CHECK_NEAR(rolni_growth_log(1e-300), -690.77552789821L, 1e-4L);
}

/* Errors over the variance may be too small for a double: then they do not say which part or growth is likeliest. */
static void test_vanished(void)
{
    static rolni_growths logs, squares;
    double cost = 0;
    int r;
    for (r = 0; r < ROLNI_FLOORS; r++)
        squares[0][r] = squares[1][r] = 1 + r, squares[2][r] = 0;
    squares[1][2] = 0;
    CHECK(rolni_growth_part(5, 1, logs, squares, &cost) == 0);
    CHECK(cost < 1);
    CHECK(rolni_growth_part(5, 2, logs, squares, &cost) == 0);
    CHECK(cost > 1e299);
}

/* All errors at one novelty, small or huge, powers of which are beyond any float: the law says there what they are. */
static void test_far_errors(void)
{
    static const double at[9] = {1e-3, 1e-2, 0.1, 1, 1e3, 1e9, 1e13, 1e20, 1e30};
    enum { COUNT = 500 };
    int which, k;
    for (which = 0; which < 9; which++) {
        rolni_growths logs, squares[1];
        roln_real always[1], grows[1];
        uint64_t seed = 23;
        double sum = 0, found;
        int halves;
        memset(logs, 0, sizeof logs), memset(squares, 0, sizeof squares);
        for (k = 0; k < COUNT; k++) {
            const roln_real error[1] = {roln_normal(&seed) / 4};
            rolni_growth_add(1, (roln_real)at[which], error, logs, squares);
            sum += (double)error[0] * (double)error[0] / COUNT;
        }
        halves = rolni_growth_solve(COUNT, 1, logs, squares, always, grows);
        found = pow((double)always[0], 2) + pow((double)grows[0], 2) * pow(at[which], halves / 2.0);
        CHECK_NEAR(found, sum, 1e-3 * sum);
    }
}

/* Evidence of any bits: deviations are numbers or there is a status, and the last ones stay. */
static void test_damaged(void)
{
    static bead_params p;
    static bead_evidence e, good;
    static bead_train w;
    static bead_work tick;
    static bead_doubt_ahead_work ahead;
    roln_real q[2] = {ROLN_C(0.25), ROLN_C(-0.25)}, qd[2] = {0, ROLN_C(0.5)};
    const roln_real most = sizeof(roln_real) == 4 ? ROLN_C(1e25) : ROLN_C(1e30);
    const roln_batch b = {1, 1, 1, NULL, q, qd, NULL, NULL};
    const roln_real huge = (roln_real)(sizeof(roln_real) == 4 ? 3e38 : 1.7e308);
    bead_latent s = {{ROLN_C(0.5)}, {0}}, other;
    bead_doubts d, kept;
    bead_outlook o, last;
    int i;
    bead_model_of(&p);
    memset(&good, 0, sizeof good);
    CHECK_OK(bead_evidence_add(&p, &b, &good, &w.evidence_add));
    good.always[0] = good.always[1] = 1, good.halves = 4, good.lasts = 1;
    CHECK_OK(bead_doubt(&p, &good, &s, &kept, &tick.doubt));
    for (i = 0; i < 4; i++) {
        e = good, e.always[0] = i < 2 ? most : 1 / most, e.grows[0] = i % 2 ? e.always[0] : 0;
        CHECK_OK(bead_doubt(&p, &e, &s, &d, &tick.doubt));
        CHECK_NEAR(d.zdd[0] / e.always[0], sqrt(i % 2 ? 1 + pow((double)d.novelty, 2) : 1), 1e-3L);
    }
    for (i = 0; i < 6; i++) {
        e = good, d = kept;
        if (i == 0) e.halves = -1;
        if (i == 1) e.halves = ROLNI_GROWTHS + 2;
        if (i == 2) e.halves = 0x7fffffff;
        if (i == 3) e.always[1] = (roln_real)NAN;
        if (i == 4) e.grows[0] = (roln_real)INFINITY;
        if (i == 5) e.grows[1] = huge;
        if (i == 5) s.z[0] = 3; /* new */
        CHECK(bead_doubt(&p, &e, &s, &d, &tick.doubt) == (i < 3 ? ROLN_E_RANGE : ROLN_E_NOT_FINITE));
        CHECK(memcmp(&d, &kept, sizeof d) == 0);
    }
    s.z[0] = ROLN_C(0.5), other = s;
    memset(&o, 0, sizeof o);
    o.P[0] = -1e6, last = o; /* a variance that is none */
    CHECK(bead_doubt_ahead(&p, &good, &s, NULL, ROLN_C(0.01), &o, &ahead) == ROLN_E_NOT_SPD);
    CHECK(memcmp(&o, &last, sizeof o) == 0 && memcmp(&s, &other, sizeof s) == 0);
}

void TEST_NAME(doubt)(void)
{
    test_ring();
    test_far();
    test_slip();
    test_overflow();
    test_rest();
    test_units_of_laws();
    test_huge_novelty();
    test_vanished();
    test_far_errors();
    test_damaged();
    plain_test_doubt();
    cart_test_doubt();
    sheet_test_doubt();
    bead_test_doubt();
    centipede_test_doubt();
    dog_test_doubt();
    test_middle();
}
