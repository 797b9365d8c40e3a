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
    CHECK_OK(plain_fit_range(&p, COUNT, q, qd, &tick.fit_range));
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

void TEST_NAME(doubt)(void)
{
    test_ring();
    test_far();
    plain_test_doubt();
    cart_test_doubt();
    sheet_test_doubt();
    bead_test_doubt();
    centipede_test_doubt();
}
