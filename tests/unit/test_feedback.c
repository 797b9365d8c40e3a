/* SPDX-License-Identifier: MIT */
/* Torques of motors and feedback of least cost: NAME_allocate against damped least squares, NAME_gains, NAME_lqr and NAME_lqr_along
   against the equations that they solve, and what they refuse; triangles of motors. */
#ifndef ROLN_DOUBLE /* before small.h, whose dt their arguments would shadow */
#include "arm.h"
#include "arm_weights.h"
#include "furuta.h"
#include "furuta_weights.h"
#endif

/* Those with learned inputs, driven by torques of the joints. */
#define CALLED(X) X(reduce) X(allocate)
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_driven
#define SMALL_INPUTS(count) 0
#include "small_models.h"

#undef CALLED
#define CALLED(X) X(decode) X(step) X(reduce) X(linear) X(allocate) X(gains) X(lqr) X(lqr_along) X(friction_of)
#include "small.h"
#include "control.h"

void TEST_NAME(feedback)(void);

#define DRIVEN_CALLED(name) name##_driven_called
static const model *const driven[MODELS] = SMALL_TABLE(SMALL_CALLED, DRIVEN_CALLED);

/* ---- motors ------------------------------------------------------------------------------------ */

/* Motors for a model, G = J^T B by columns as far as it is known, and the largest number of G. */
typedef struct {
    int motors;
    roln_real z[MAXN], tau_z[MAXN], B[MAXN * 8], top;
    ld G[MAXN * 8];
} drive;

/* G and top, of z and B. */
static void reduce_motors(int k, const instance *m, drive *x)
{
    const int N = N_OF(k), n = n_OF(k), motors = x->motors;
    roln_real column[MAXN], g[MAXN];
    int i, j;
    x->top = 0;
    for (j = 0; j < motors; j++) {
        for (i = 0; i < N; i++)
            column[i] = x->B[i * motors + j];
        CHECK_OK(m->of->reduce(m, x->z, column, g, spare));
        for (i = 0; i < n; i++) {
            x->G[i * motors + j] = (ld)g[i];
            x->top = ROLN_ABS(g[i]) > x->top ? ROLN_ABS(g[i]) : x->top;
        }
    }
}

static void place_motors(int k, const instance *m, int motors, uint64_t *s, drive *x)
{
    x->motors = motors;
    valid(k, s);
    dyadic(n_OF(k), 1, s, x->z), dyadic(n_OF(k), 1, s, x->tau_z), dyadic(N_OF(k) * motors, 1, s, x->B);
    reduce_motors(k, m, x);
}

/* (G^T G + mu^2 I) u = G^T tau_z */
static void check_damped(int n, const drive *x, roln_real mu, const roln_real *u)
{
    static ld A[TN * TN], b[TN];
    const int motors = x->motors;
    ld top = 0;
    int i, j, p;
    for (j = 0; j < motors; j++) {
        for (b[j] = 0, i = 0; i < n; i++)
            b[j] += x->G[i * motors + j] * (ld)x->tau_z[i];
        for (p = 0; p < motors; p++) {
            A[j * motors + p] = j == p ? (ld)mu * (ld)mu : 0;
            for (i = 0; i < n; i++)
                A[j * motors + p] += x->G[i * motors + j] * x->G[i * motors + p];
        }
    }
    t_solve(motors, 1, A, b);
    for (j = 0; j < motors; j++)
        top = fabsl(b[j]) > top ? fabsl(b[j]) : top;
    for (j = 0; j < motors; j++) /* condition up to |G|^2 / mu^2 = 64 n motors */
        BOUND("allocation, eps", fabsl((ld)u[j] - b[j]) / (top + 1e-3L * (ld)mu) / EPS, 5000);
}

/* What u does not make of tau_z, as a part of it. */
static void check_missed(int n, const drive *x, const roln_real *u, roln_real missed)
{
    ld most = 0, lost = 0, rest, size = 0;
    int i, j;
    for (i = 0; i < n; i++) {
        rest = (ld)x->tau_z[i];
        for (j = 0; j < x->motors; j++)
            rest -= x->G[i * x->motors + j] * (ld)u[j], size = ROLN_MAX(size, fabsl(x->G[i * x->motors + j] * (ld)u[j]));
        most += (ld)x->tau_z[i] * (ld)x->tau_z[i], lost += rest * rest;
    }
    BOUND("allocation, what is missed, eps", fabsl((ld)missed - sqrtl(lost / most)) / (1 + size / sqrtl(most)) / EPS, 200);
}

/* As many motors as z has: exact as mu -> 0. */
static void check_square(int n, const drive *x, roln_real mu, const roln_real *u)
{
    static ld A[TN * TN], b[TN];
    ld top = 0;
    int i;
    memcpy(A, x->G, (size_t)(n * n) * sizeof *A);
    for (i = 0; i < n; i++)
        b[i] = (ld)x->tau_z[i];
    t_solve(n, 1, A, b);
    for (i = 0; i < n; i++)
        top = fabsl(b[i]) > top ? fabsl(b[i]) : top;
    if (top * (ld)mu > 0.25L) return; /* badly placed motors: damped, or lost in rounding */
    for (i = 0; i < n; i++)
        CHECK_NEAR(u[i], b[i], PICK(2e-2L, 1e-9L) * top);
}

/* Of a model with inputs, no motors are those that it has learned, undamped. */
static void check_learned_inputs(int k, const roln_real *z, const roln_real *tau_z)
{
    static const roln_motors learned = {.count = 0};
    const instance m = of_model(k);
    const int inputs = m.of->md->inputs;
    roln_real u[MAXN], same_u[MAXN], lost = 7, same_lost = 7;
    if (inputs == 0) return;
    fill(MAXN, 7, u), fill(MAXN, 7, same_u);
    CHECK(m.of->allocate(&m, z, NULL, tau_z, u, &lost, spare) == m.of->allocate(&m, z, &learned, tau_z, same_u, &same_lost, spare));
    CHECK(same(MAXN, u, same_u) && same(1, &lost, &same_lost));
}

/* As many motors as z has, undamped: two of them nearly parallel, or one in units of its own. What they are given makes tau_z, or
   they are refused; down to a thousandth apart as float, and in any unit to 10^-4, they are not. */
static void test_near_motors(int k)
{
    static drive x;
    const instance m = trained(driven[k], scale_of(k), theta_k);
    const int N = N_OF(k), n = n_OF(k);
    const roln_motors f = {.count = n, .B = x.B};
    roln_real u[8];
    uint64_t s = 290 + (uint64_t)k;
    int round, kind, i, e;
    for (round = 0; round < 40 && n > 1 && n <= 8; round++)
        for (kind = 0; kind < 2; kind++)
            for (e = 1; e <= 5; e++) {
                static ld A[TN * TN], b[TN];
                const roln_real by = (roln_real)pow(10, -e);
                ld top = 0, size = 0, off = 0;
                roln_status st;
                place_motors(k, &m, n, &s, &x);
                for (i = 0; i < N; i++)
                    x.B[i * n + 1] = (kind == 0 ? x.B[i * n] : 0) + by * x.B[i * n + 1];
                reduce_motors(k, &m, &x);
                fill(8, 7, u);
                st = m.of->allocate(&m, x.z, &f, x.tau_z, u, NULL, ROOM(allocate));
                ROOM_KEPT();
                memcpy(A, x.G, (size_t)(n * n) * sizeof *A), widen(n, x.tau_z, b);
                t_solve(n, 1, A, b);
                for (i = 0; i < n; i++)
                    top = ROLN_MAX(top, fabsl(b[i]) * (i == 1 && kind == 1 ? (ld)by : 1)),
                    size = ROLN_MAX(size, fabsl((ld)x.tau_z[i]));
                if (top * (ld)x.top > 30 * size / (kind == 0 ? (ld)by : 1)) continue; /* by chance others are nearly so, too */
                if (st != ROLN_OK) {
                    CHECK(e > PICK(3, 5) - (kind == 0) && all(8, u, 7));
                    continue;
                }
                for (i = 0; i < n; i++) {
                    ld rest = (ld)x.tau_z[i];
                    int j;
                    for (j = 0; j < n; j++)
                        rest -= x.G[i * n + j] * (ld)u[j];
                    off = ROLN_MAX(off, fabsl(rest));
                }
                BOUND(kind ? "motors of other units: what is missed" : "motors nearly parallel: what is missed", off / size,
                      PICK(0.011L, 1e-7L));
            }
}

/* Forces near the end of the type: torques that are numbers, or a status. Torques in the place of the force are the same. */
static void test_allocate_ends(int k)
{
    static drive x;
    const instance m = trained(driven[k], scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real u[8], lost;
    roln_motors f = {.count = n, .B = x.B};
    uint64_t s = 290 + (uint64_t)k;
    int round, i, j;
    for (round = 0; round < 400; round++) {
        roln_real most, force[MAXN];
        roln_status st;
        place_motors(k, &m, n, &s, &x);
        f.mu = x.top / 8;
        CHECK_OK(m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)));
        rolni_copy(n, x.tau_z, force);
        CHECK_OK(m.of->allocate(&m, x.z, &f, force, force, u + n, ROOM(allocate)));
        CHECK(memcmp(u, force, (size_t)n * sizeof *u) == 0 && all(1, &lost, u[n]));
        f.mu = 0;
        for (i = 0; i < N_OF(k) * n; i++)
            x.B[i] *= (ROLN_C(0.25) + (roln_real)(round % 16) / 16) / x.top;
        CHECK((st = m.of->allocate(&m, x.z, &f, x.tau_z, u, NULL, ROOM(allocate))) == ROLN_OK || st == ROLN_E_NOT_SPD);
        for (i = 0, most = 0; i < n; i++)
            most = ROLN_MAX(most, ROLN_ABS(u[i]));
        if (st != ROLN_OK || !(most > ROLN_C(0.5))) continue;
        for (i = -20; i < 20; i++) { /* the largest torque is the largest number, nearly */
            int good;
            lost = 7, fill(8, 7, u);
            for (j = 0; j < n; j++)
                force[j] = x.tau_z[j] * (PICK(3.4028234e38f, 1.7976931348623157e308) / most) * (1 + (roln_real)i * ROLN_EPS / 2);
            good = m.of->allocate(&m, x.z, &f, force, u, &lost, ROOM(allocate)) == ROLN_OK;
            CHECK(good ? roln_all_finite(n, u) && roln_finite(lost) : all(8, u, 7) && all(1, &lost, 7));
        }
    }
}

/* Damped least squares. */
static void test_allocate(int k)
{
    static drive x;
    const instance m = trained(driven[k], scale_of(k), theta_k);
    const int n = n_OF(k);
    roln_real u[8], lost = 0;
    uint64_t s = 280 + (uint64_t)k;
    int motors, i, round, wild = 0, missed = 0, tried = 0;
    roln_motors f = {.B = x.B};
    for (motors = 1; motors <= 6; motors++)
        for (round = 0; round < 20; round++) {
            roln_real mu;
            place_motors(k, &m, motors, &s, &x);
            mu = x.top / 8, f.count = motors, f.mu = mu;
            CHECK_OK(m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)));
            ROOM_KEPT();
            check_damped(n, &x, mu, u);
            check_missed(n, &x, u, lost);
            if (motors == n) {
                f.mu = mu * PICK(1e-2f, 1e-7);
                if (m.of->allocate(&m, x.z, &f, x.tau_z, u, NULL, ROOM(allocate)) == ROLN_OK) check_square(n, &x, mu, u);
            }
            if (motors < n) { /* mu = 0 and too few motors: refused and u untouched, or where rounding hides it no wild torque */
                int taken;
                fill(8, 7, u);
                lost = 7, f.mu = 0;
                taken = m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK;
                wild += !taken && !all(1, &lost, 7);
                for (i = 0; i < motors && taken; i++)
                    wild += !(ROLN_ABS(u[i]) * x.top < 100);
                wild += !all(taken ? 8 - motors : 8, u + (taken ? motors : 0), 7);
                missed += taken, tried++;
            }
        }
    CHECK_BELOW(wild, 0);
    CHECK_BELOW(missed, tried / 20);
    for (motors = -1; motors < 1; motors++) {
        fill(8, 7, u);
        lost = 7, f.count = motors;
        CHECK(m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_E_LENGTH && all(8, u, 7) && all(1, &lost, 7));
    }
    CHECK(m.of->allocate(&m, x.z, NULL, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_E_LENGTH); /* it has learned no inputs */
    check_learned_inputs(k, x.z, x.tau_z);
    place_motors(k, &m, n, &s, &x);
    f.count = n, f.mu = 1;
    fill(n, 0, x.tau_z);
    CHECK(m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK && all(n, u, 0) && all(1, &lost, 0));
    { /* motors so weak that their share is no number, undamped: none of it is missed */
        const roln_real little = PICK(1e-30f, 1e-200), much = PICK(1e30f, 1e200);
        CHECK(rolni_allocation_residual(1, &little, &much, 0) <= 0);
    }
    x.tau_z[0] = PICK(1e-30f, 1e-250), f.mu = PICK(1e15f, 1e100); /* damped to 0: all of it is missed */
    CHECK(m.of->allocate(&m, x.z, &f, x.tau_z, u, &lost, ROOM(allocate)) == ROLN_OK && all(n, u, 0) && all(1, &lost, 1));
}

/* kp = diag(J^T Kp J), J by columns from the velocity that unit zd decodes to. */
static void test_gains(int k)
{
    const instance m = of_model(k);
    const int N = N_OF(k), n = n_OF(k);
    roln_real z[MAXN], K[2 * MAXN], kp[MAXN], kd[MAXN], zd[MAXN], q[MAXN], J[MAXN], *of[2] = {z, K};
    uint64_t s = 290 + (uint64_t)k;
    int i, j;
    valid(k, &s);
    dyadic(n, 1, &s, z), dyadic(2 * N, 1, &s, K);
    CHECK_OK(m.of->gains(&m, z, K, K + N, kp, kd, ROOM(gains)));
    ROOM_KEPT();
    for (j = 0; j < n; j++) {
        ld p = 0, d = 0, size = 0;
        fill(n, 0, zd), zd[j] = 1;
        CHECK_OK(m.of->decode(&m, z, zd, q, J, spare));
        for (i = 0; i < N; i++) {
            p += (ld)K[i] * (ld)J[i] * (ld)J[i], d += (ld)K[N + i] * (ld)J[i] * (ld)J[i];
            size += (ld)J[i] * (ld)J[i];
        }
        BOUND("gains, eps", (fabsl((ld)kp[j] - p) + fabsl((ld)kd[j] - d)) / size / EPS, 10);
    }
    for (i = 0; i < 2; i++) {
        of[i][0] = (roln_real)NAN;
        fill(n, 7, kp), fill(n, 7, kd);
        CHECK(m.of->gains(&m, z, K, K + N, kp, kd, ROOM(gains)) == ROLN_E_NOT_FINITE && all(n, kp, 7) && all(n, kd, 7));
        of[i][0] = 0;
    }
}

/* ---- feedback of least cost ------------------------------------------------------------------- */

/* What NAME_lqr is asked, and what it gives. */
typedef struct {
    roln_real s[2 * MAXN], u[MAXN], q[MAXN], qd[MAXN], r[MAXN], B[MAXN * MAXN], K[2 * MAXN * MAXN], P[4 * MAXN * MAXN];
    roln_motors motors;
    roln_cost cost;
    int count; /* numbers of u */
} feedback;

/* A pose; two motors, or one at each joint; dear motors keep what is very unstable within the digits. */
static void place_feedback(int k, int two, uint64_t *s, feedback *x)
{
    const int N = N_OF(k), n = n_OF(k);
    int i;
    memset(x, 0, sizeof *x);
    valid(k, s);
    dyadic(n, ROLN_C(0.5), s, x->s), dyadic(N * 2, 1, s, x->B), dyadic(N, ROLN_C(0.125), s, x->u);
    dyadic(N, ROLN_C(0.25), s, x->q), dyadic(N, ROLN_C(0.25), s, x->qd);
    for (i = 0; i < N; i++)
        x->q[i] += 1, x->qd[i] += ROLN_C(0.5), x->r[i] = ROLN_C(0.125) * (roln_real)(1 + i % 2);
    x->motors.count = 2, x->motors.B = x->B;
    x->cost.q = x->q, x->cost.qd = x->qd, x->cost.u = x->r, x->cost.dt = dt, x->cost.motors = two ? &x->motors : NULL;
    x->count = two ? 2 : F_OF(k);
}

/* A, B of the step, and Q = diag(J^T q J, J^T qd J), from NAME_linear and NAME_decode. */
static void feedback_twin(int k, const instance *m, const feedback *x, ld *A, ld *B, ld *Q)
{
    static roln_real a[4 * MAXN * MAXN], b[2 * MAXN * MAXN], J[MAXN * MAXN];
    const int N = N_OF(k), n = n_OF(k), F = F_OF(k), two = x->cost.motors != NULL;
    roln_real s[2 * MAXN], tau[MAXN], unit_zd[MAXN], q[MAXN];
    int i, j, p;
    memcpy(s, x->s, sizeof s), memcpy(tau, x->u, sizeof tau);
    for (i = 0; i < N && two; i++)
        tau[i] = x->B[2 * i] * x->u[0] + x->B[2 * i + 1] * x->u[1];
    for (i = 0; i < n && models[k]->md->lnn.friction; i++) { /* where it has no slope any more */
        roln_real c[MAXN], v[MAXN];
        CHECK_OK(m->of->friction_of(m, c, v));
        s[n + i] += s[n + i] < 0 ? -4 * v[i] : 4 * v[i];
    }
    CHECK_OK(m->of->linear(m, s, s + n, tau, dt, a, b, spare));
    widen(4 * n * n, a, A);
    for (i = 0; i < 2 * n; i++)
        for (j = 0; j < x->count; j++)
            for (B[i * x->count + j] = two ? 0 : (ld)b[i * F + j], p = 0; p < N && two; p++)
                B[i * x->count + j] += (ld)b[i * F + p] * (ld)x->B[2 * p + j];
    for (j = 0; j < n; j++) {
        fill(n, 0, unit_zd), unit_zd[j] = 1;
        CHECK_OK(m->of->decode(m, x->s, unit_zd, q, J + j * N, spare));
    }
    for (i = 0; i < 4 * n * n; i++)
        Q[i] = 0;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            for (p = 0; p < N; p++) {
                const ld JJ = (ld)J[i * N + p] * (ld)J[j * N + p];
                Q[i * 2 * n + j] += JJ * (ld)x->q[p], Q[(n + i) * 2 * n + n + j] += JJ * (ld)x->qd[p];
            }
}

/* P and K solve P = Q + A^T P (A - B K), (R + B^T P B) K = B^T P A, to rounding; P is symmetric to the bit. */
static void check_feedback(int k, const feedback *x, const ld *A, const ld *B, const ld *Q)
{
    static ld PA[4 * MAXN * MAXN], PB[2 * MAXN * MAXN];
    const int w = 2 * n_OF(k), c = x->count;
    ld top = 0, lost = 0, size = 0;
    int i, j, p, l;
    for (i = 0; i < w; i++) {
        for (j = 0; j < w; j++)
            for (PA[i * w + j] = 0, p = 0; p < w; p++)
                PA[i * w + j] += (ld)x->P[i * w + p] * A[p * w + j];
        for (j = 0; j < c; j++)
            for (PB[i * c + j] = 0, p = 0; p < w; p++)
                PB[i * c + j] += (ld)x->P[i * w + p] * B[p * c + j];
    }
    for (i = 0; i < w; i++)
        for (j = 0; j < w; j++) {
            ld rest = Q[i * w + j] - (ld)x->P[i * w + j];
            CHECK(same(1, x->P + i * w + j, x->P + j * w + i));
            for (p = 0; p < w; p++) {
                ld a = A[p * w + j], sum = fabsl(a);
                for (l = 0; l < c; l++)
                    a -= B[p * c + l] * (ld)x->K[l * w + j], sum += fabsl(B[p * c + l] * (ld)x->K[l * w + j]);
                rest += PA[p * w + i] * a, size += fabsl(PA[p * w + i]) * sum;
            }
            lost = fabsl(rest) > lost ? fabsl(rest) : lost;
        }
    BOUND("feedback, equation of P, eps", lost / (1 + size) / EPS, 4);
    for (i = 0; i < c; i++)
        for (j = 0; j < w; j++) {
            ld rest = (ld)x->r[i] * (ld)x->K[i * w + j];
            for (top = fabsl(rest), p = 0; p < w; p++) {
                ld a = A[p * w + j];
                for (l = 0; l < c; l++)
                    a -= B[p * c + l] * (ld)x->K[l * w + j], top += fabsl(PB[p * c + i] * B[p * c + l] * (ld)x->K[l * w + j]);
                rest -= PB[p * c + i] * a, top += fabsl(PB[p * c + i] * A[p * w + j]);
            }
            BOUND("feedback, equation of K, eps", fabsl(rest) / (top + 1e-9L * size) / EPS, 3000);
        }
}

/* Along a reference that stays where it is, a cost P at its end leaves the gains what they are; without P they come to them. */
static void check_along(int k, const instance *m, const feedback *x)
{
    enum { STEPS = 3, LONG = 4000 };
    static roln_real s[(LONG + 1) * 2 * MAXN], u[LONG * MAXN], K[LONG * 2 * MAXN * MAXN];
    const int w = 2 * n_OF(k), c = x->count;
    const ld top = largest(c * w, x->K);
    int i;
    for (i = 0; i <= LONG; i++) {
        memcpy(s + i * w, x->s, (size_t)w * sizeof *s);
        if (i < LONG) memcpy(u + i * c, x->u, (size_t)c * sizeof *u);
    }
    CHECK_OK(m->of->lqr_along(m, &x->cost, STEPS, s, u, x->P, K, ROOM(lqr_along)));
    ROOM_KEPT();
    for (i = 0; i < STEPS; i++)
        BOUND("gains along, cost at the end", furthest(c * w, K + i * c * w, x->K) / top, PICK(5e-3L, 1e-8L));
    fill(LONG * c * w, 7, K);
    CHECK_OK(m->of->lqr_along(m, &x->cost, LONG, s, u, NULL, K, spare));
    CHECK_BELOW(furthest(c * w, K, x->K), furthest(c * w, K + (LONG - 1) * c * w, x->K) / 4);
}

/* Wrong numbers: a status, and what was there. */
static void check_feedback_refused(int k, const instance *m, const feedback *good)
{
    static feedback x;
    static roln_real along[4 * MAXN];
    const roln_real nan = (roln_real)NAN;
    int what, st, kept;
    for (what = 0; what < 14; what++) {
        roln_status want = ROLN_E_NOT_FINITE;
        x = *good;
        x.cost.q = x.q, x.cost.qd = x.qd, x.cost.u = x.r, x.motors.B = x.B;
        if (good->cost.motors) x.cost.motors = &x.motors;
        fill(2 * MAXN * MAXN, 7, x.K);
        if (what == 0) x.s[0] = nan;
        if (what == 1) x.u[0] = nan;
        if (what == 2) x.q[N_OF(k) - 1] = nan;
        if (what == 3) x.qd[0] = (roln_real)INFINITY;
        if (what == 4) x.r[1 % x.count] = nan;
        if (what == 5) x.q[0] = -1, want = ROLN_E_NOT_SPD;
        if (what == 6) x.qd[N_OF(k) - 1] = -1, want = ROLN_E_NOT_SPD;
        if (what == 7) x.r[0] = 0, want = ROLN_E_NOT_SPD;
        if (what == 8) x.cost.dt = nan, want = ROLN_E_RANGE;
        if (what == 12) x.cost.dt = -dt, want = ROLN_E_RANGE;
        if (what == 13) x.cost.dt = 0, want = ROLN_E_RANGE;
        if (what == 9) x.motors.count = 0, want = ROLN_E_LENGTH;
        if (what == 10) x.motors.count = N_OF(k) + 1, want = ROLN_E_LENGTH;
        if (what == 11) x.P[0] = -1000, want = ROLN_E_NOT_SPD;
        if ((what == 9 || what == 10) && !good->cost.motors) continue;
        memcpy(along, x.s, sizeof x.s), memcpy(along + 2 * n_OF(k), good->s, sizeof x.s);
        if (what != 11) {
            st = m->of->lqr(m, &x.cost, x.s, x.u, x.K, x.P, spare);
            kept = all(2 * MAXN * MAXN, x.K, 7) && same(4 * MAXN * MAXN, x.P, good->P);
            if (!CHECK(st != ROLN_OK && kept && (what < 4 || st == (int)want)))
                printf("    %s, wrong number %d: status %d\n", models[k]->name, what, st);
        }
        st = m->of->lqr_along(m, &x.cost, 1, along, x.u, x.P, x.K, spare);
        if (!CHECK(st != ROLN_OK && all(2 * MAXN * MAXN, x.K, 7)))
            printf("    %s, along, wrong number %d\n", models[k]->name, what);
    }
    CHECK(m->of->lqr_along(m, &good->cost, 0, good->s, good->u, NULL, x.K, spare) == ROLN_E_LENGTH);
}

#ifndef ROLN_DOUBLE
/* Row by row, |E - K| as a part of the row; states in units in which they cost alike, P_ii = 1. */
static ld lost_of_rows(int w, int motors, const roln_real *P, const roln_real *K, const roln_real *E)
{
    ld worst = 0;
    int i, j;
    for (j = 0; j < motors; j++) {
        ld off = 0, most = 0;
        for (i = 0; i < w; i++) {
            const ld one = sqrtl((ld)P[i * (w + 1)]), k = fabsl((ld)K[j * w + i]) / one;
            const ld e = fabsl((ld)E[j * w + i] - (ld)K[j * w + i]) / one;
            off = e > off ? e : off, most = k > most ? k : most;
        }
        worst = off / most > worst ? off / most : worst;
    }
    return worst;
}

/* The examples: deviations of joints and of motors over four decades, rising, falling and mixed. A step of NAME_lqr_along from
   the P of NAME_lqr gives its K again, row by row, with light states beside heavy ones: of the arm to 1e-4; of the pendulum, whose
   one motor leaves P with few digits, to what moves of P by eps do. */
static void test_light_states(void)
{
    static union {
        arm_lqr_work arm;
        arm_lqr_along_work arm_along;
        arm_inverse_work inverse;
        arm_lift_work lift;
        furuta_lqr_work furuta;
        furuta_lqr_along_work furuta_along;
    } work;
    static const roln_real first[2] = {1, 0};
    static const roln_motors motor = {.count = 1, .B = first};
    const furuta_latent up[2] = {{{0, ROLN_C(3.14159265)}, {0, 0}}, {{0, ROLN_C(3.14159265)}, {0, 0}}};
    arm_latent s[2];
    roln_real q[6], qd[6], r[6], tau_z[6], u[6], K[72], E[72], P[144], M[16];
    ld lost, wide;
    const roln_real still[6] = {0, 0, 0, 0, 0, 0};
    const roln_cost cost = {q, qd, r, ROLN_C(0.005), NULL}, by_one = {q, qd, r, ROLN_C(0.01), &motor};
    uint64_t seed = 19;
    int round, move, i;
    memset(s, 0, sizeof s);
    for (i = 0; i < 6; i++)
        s[0].z[i] = s[1].z[i] = (arm_weights.z_min[i] + arm_weights.z_max[i]) / 2;
    CHECK_OK(arm_inverse(&arm_weights, s, NULL, still, tau_z, &work.inverse));
    CHECK_OK(arm_lift(&arm_weights, s, tau_z, u, &work.lift));
    for (round = 0; round < 40; round++) {
        for (i = 0; i < 6; i++) {
            const double share = round == 0 ? i / 5.0 : round == 1 ? 1 - i / 5.0 : (double)roln_uniform(&seed);
            q[i] = (roln_real)pow(10, 8 * share), qd[i] = round % 3 ? 0 : q[i] / 1000;
            r[i] = (roln_real)pow(10, round < 20 ? 0 : 4 * (double)roln_uniform(&seed) - 2);
        }
        if (CHECK_OK(arm_lqr(&arm_weights, &cost, s, u, K, P, &work.arm))) {
            CHECK_OK(arm_lqr_along(&arm_weights, &cost, 1, s, u, P, E, &work.arm_along));
            BOUND("arm, light states", lost_of_rows(12, 6, P, K, E), 1e-4L);
        }
        r[0] *= 10000; /* the motor's deviation is 0.01 Nm */
        if (CHECK_OK(furuta_lqr(&furuta_weights, &by_one, up, NULL, K, P, &work.furuta))) {
            CHECK_OK(furuta_lqr_along(&furuta_weights, &by_one, 1, up, NULL, P, E, &work.furuta_along));
            lost = lost_of_rows(4, 1, P, K, E), wide = EPS;
            for (move = 0; move < 8; move++) {
                for (i = 0; i < 16; i++)
                    M[i] = i % 4 > i / 4 ? P[i] : P[i] * (1 + ROLN_EPS * (2 * roln_uniform(&seed) - 1));
                for (i = 0; i < 16; i++)
                    M[i] = i % 4 > i / 4 ? M[i % 4 * 4 + i / 4] : M[i];
                CHECK_OK(furuta_lqr_along(&furuta_weights, &by_one, 1, up, NULL, M, E, &work.furuta_along));
                wide = lost_of_rows(4, 1, P, K, E) > wide ? lost_of_rows(4, 1, P, K, E) : wide;
            }
            BOUND("furuta, light states", lost, 0.01L);
            BOUND("furuta, light states, in moves of P", lost / wide, 3);
        }
    }
}
#endif

/* Is P a weight? The same answer in all units of states, over six decades, of positive and of singular ones; and each number that
   makes a light part of it none. */
static void test_weights_of_ends(void)
{
    enum { n = 6 };
    uint64_t s = 23;
    int round, rank, i, j;
    for (round = 0; round < 400; round++) {
        roln_real C[n * n], P[n * n], L[n * n], t[n], was;
        rank = round % (n + 1);
        for (i = 0; i < n; i++)
            t[i] = round % 2 ? (roln_real)pow(10, 6 * (double)roln_uniform(&s) - 3) : 1;
        for (i = 0; i < n * n; i++)
            C[i] = i / n < rank && i % n != 4 ? roln_normal(&s) * t[i % n] : 0;
        fill(n * n, 0, P);
        roln_mm_at(n, n, n, C, C, P);
        CHECK_OK(rolni_goal_weighs(n, P, L)); /* state 4 is without cost */
        i = round % 4, j = i + 1 + round % (n - 1 - i), j = j == 4 ? 5 : j;
        if (rank == 0) continue;
        was = P[i * n + j], P[i * n + j] += ROLN_SQRT(P[i * (n + 1)]) * ROLN_SQRT(P[j * (n + 1)]) / 1000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD); /* not symmetric */
        P[i * n + j] = P[j * n + i] = ROLN_SQRT(P[i * (n + 1)]) * ROLN_SQRT(P[j * (n + 1)]) * ROLN_C(1.001);
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[i * n + j] = P[j * n + i] = was;
        was = P[i * (n + 1)], P[i * (n + 1)] = -was / 1000000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[i * (n + 1)] = was;
        P[4 * n + i] = P[i * n + 4] = ROLN_SQRT(was) / 1000;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_SPD);
        P[4 * n + i] = P[i * n + 4] = 0, P[0] = (roln_real)NAN;
        CHECK(rolni_goal_weighs(n, P, L) == ROLN_E_NOT_FINITE);
    }
}

/* The midpoint rule may find a step too long. */
static int can_step(const instance *m, const feedback *x)
{
    roln_real s[2 * MAXN];
    memcpy(s, x->s, sizeof s);
    return m->of->step(m, s, s + m->of->md->lnn.n, x->u, dt, spare) == ROLN_OK;
}

static void test_lqr(int k, int two)
{
    static feedback x;
    static ld A[4 * MAXN * MAXN], B[2 * MAXN * MAXN], Q[4 * MAXN * MAXN];
    const instance m = of_model(k);
    uint64_t s = 340 + (uint64_t)k;
    int round;
    if (two && (models[k]->md->inputs > 0 || N_OF(k) < 2)) return;
    for (round = 0; round < 4; round++) {
        roln_status st;
        place_feedback(k, two, &s, &x);
        st = m.of->lqr(&m, &x.cost, x.s, x.u, x.K, x.P, ROOM(lqr));
        ROOM_KEPT();
        if (k == PUSHED && st == ROLN_E_NO_CONVERGENCE && !can_step(&m, &x)) continue;
        if (k == DEEP && PICK(1, 0) > 0 && st == ROLN_E_NO_CONVERGENCE) continue; /* J of size 1e3, beyond the digits of float */
        if (!CHECK_OK(st)) {
            printf("    %s, two motors %d: status %d\n", models[k]->name, two, st);
            continue;
        }
        feedback_twin(k, &m, &x, A, B, Q);
        check_feedback(k, &x, A, B, Q);
        if (round == 0) check_along(k, &m, &x);
        if (round == 1) check_feedback_refused(k, &m, &x);
    }
}

/* rolni_spans: the least pivot is 8 (n + count) eps times the largest number above it. rolni_solve_square solves R^T R y. Neither
   reads numbers below or behind the triangle R [n][n]. rolni_largest reads n numbers. */
static void test_triangles(void)
{
    enum { MOST = 6, count = 3 };
    uint64_t seed = 4;
    int n, i, k;
    for (n = 1; n <= MOST; n++) {
        const roln_real part = 8 * (roln_real)(n + count) * ROLN_EPS;
        roln_real R[MOST * (MOST + 2)], y[MOST + 1];
        long double x[MOST], Rx[MOST] = {0};
        fill(MOST * (MOST + 2), (roln_real)NAN, R), fill(MOST + 1, 7, y);
        for (i = 0; i < n; i++)
            for (x[i] = (long double)roln_normal(&seed), k = i; k < n; k++)
                R[i * n + k] = i == k ? 1 + roln_uniform(&seed) : roln_uniform(&seed) / MOST;
        CHECK(rolni_spans(n, count, R) == 1);
        for (i = 0; i < n; i++)
            for (k = i; k < n; k++)
                Rx[i] += (long double)R[i * n + k] * x[k];
        for (i = 0; i < n; i++) {
            long double sum = 0;
            for (k = 0; k <= i; k++)
                sum += (long double)R[k * n + i] * Rx[k];
            y[i] = (roln_real)sum;
        }
        rolni_solve_square(n, R, y);
        for (i = 0; i < n; i++)
            CHECK_NEAR(y[i], x[i], 100 * (double)ROLN_EPS);
        CHECK(all(1, y + n, 7));
        for (i = 0; i < n; i++) {
            roln_real *const pivot = R + i * (n + 1), was = *pivot, top = 0;
            for (k = 0; k < i; k++)
                top = ROLN_MAX(top, R[k * n + i]);
            for (k = -1; k <= 1; k += 2) {
                *pivot = i > 0 ? (roln_real)k * part * top * ROLN_C(1.25) : (roln_real)k * ROLN_C(1e-20);
                CHECK(rolni_spans(n, count, R) == 1);
                *pivot = i > 0 ? (roln_real)k * part * top * ROLN_C(0.8) : 0;
                CHECK(rolni_spans(n, count, R) == 0);
            }
            *pivot = (roln_real)NAN;
            CHECK(rolni_spans(n, count, R) == 0);
            *pivot = was;
        }
        for (i = 0; i < n; i++) {
            fill(MOST + 1, 7, y);
            for (k = 0; k < n; k++)
                y[k] = (roln_real)(k == i ? -3 : k % 3 - 1);
            CHECK_NEAR(rolni_largest(n, y), 3, 0);
        }
    }
}

void TEST_NAME(feedback)(void)
{
    int k;
    test_triangles();
#ifndef ROLN_DOUBLE
    test_light_states();
#endif
    test_weights_of_ends();
    for (k = 0; k < MODELS; k++) {
        test_allocate(k);
        test_allocate_ends(k);
        test_near_motors(k);
        test_gains(k);
        test_lqr(k, 0);
        test_lqr(k, 1);
    }
    print_bounds();
}
