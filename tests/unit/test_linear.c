/* SPDX-License-Identifier: MIT */
/* Linearisation of a step (NAME_linear): against differences of NAME_step for every integrator and kind of input, and its
   failures. */

#define CALLED(X) X(linear) X(step)
#ifdef ROLN_DOUBLE
/* The small models by every integrator, driven by torques; those with learned inputs by these, too. */
#define SMALL(name) name##_euler
#define SMALL_STEP(scheme) euler
#define SMALL_INPUTS(count) 0
#include "small_models.h"
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_inputs_euler
#define SMALL_STEP(scheme) euler
#include "small_models.h"
#define SMALL(name) name##_rk4
#define SMALL_STEP(scheme) rk4
#define SMALL_INPUTS(count) 0
#include "small_models.h"
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_inputs_rk4
#define SMALL_STEP(scheme) rk4
#include "small_models.h"
#define SMALL(name) name##_midpoint
#define SMALL_STEP(scheme) midpoint
#define SMALL_INPUTS(count) 0
#include "small_models.h"
#define SMALL_DRIVEN_ONLY
#define SMALL(name) name##_inputs_midpoint
#define SMALL_STEP(scheme) midpoint
#include "small_models.h"
#endif

#include "small.h"
#include "control.h"

void TEST_NAME(linear)(void);

#ifdef ROLN_DOUBLE
#define EULER_CALLED(name) name##_euler_called
#define INPUTS_EULER_CALLED(name) name##_inputs_euler_called
#define RK4_CALLED(name) name##_rk4_called
#define INPUTS_RK4_CALLED(name) name##_inputs_rk4_called
#define MIDPOINT_CALLED(name) name##_midpoint_called
#define INPUTS_MIDPOINT_CALLED(name) name##_inputs_midpoint_called
static const model *const by_tau[][MODELS] = {SMALL_TABLE(EULER_CALLED, EULER_CALLED), SMALL_TABLE(RK4_CALLED, RK4_CALLED),
                                              SMALL_TABLE(MIDPOINT_CALLED, MIDPOINT_CALLED)};
static const model *const by_inputs[][MODELS] = {SMALL_TABLE(EULER_CALLED, INPUTS_EULER_CALLED),
                                                 SMALL_TABLE(RK4_CALLED, INPUTS_RK4_CALLED),
                                                 SMALL_TABLE(MIDPOINT_CALLED, INPUTS_MIDPOINT_CALLED)};
#endif

enum { MAXOUT = 256 };

/* No force is a force of 0; and a step that fails gives its status, whatever lies in the scratch. */
static void test_linear_calls(int k)
{
    const instance m = of_model(k);
    const int n = n_OF(k), F = F_OF(k), nn = 4 * n * n, nf = 2 * n * F,
              P = roln_ae_params(&models[k]->md->ae) + rolni_base_at(&models[k]->md->lnn);
    roln_real none[MAXN] = {0}, s[2 * MAXN], s0[2 * MAXN], A[MAXOUT], A0[MAXOUT], B[MAXOUT], B0[MAXOUT], was[2 * MAXN];
    roln_real *work;
    uint64_t seed = 255 + (uint64_t)k;
    parameters(k, &seed, theta_k);
    dyadic(2 * n, 1, &seed, s);
    memcpy(s0, s, sizeof s), memcpy(was, s, sizeof s);
    CHECK_OK(m.of->linear(&m, s, s + n, NULL, dt / 8, A, B, ROOM(linear)));
    CHECK_OK(m.of->linear(&m, s0, s0 + n, none, dt / 8, A0, B0, ROOM(linear)));
    CHECK(same(2 * n, s, s0) && same(nn, A, A0) && same(nf, B, B0) && !same(2 * n, s, was));
    if (!models[k]->md->lnn.base) return;
    theta_k[P] = -1; /* the base point is not SPD */
    work = ROOM(linear);
    fill(models[k]->scratch.linear, ROLN_C(0.5), work);
    memcpy(s, was, sizeof s), fill(MAXOUT, 7, A), fill(MAXOUT, 7, B);
    CHECK(m.of->linear(&m, s, s + n, none, dt / 8, A, B, work) == ROLN_E_NOT_SPD);
    CHECK(same(2 * n, s, was) && all(MAXOUT, A, 7) && all(MAXOUT, B, 7));
    CHECK(m.of->step(&m, s, s + n, none, dt / 8, ROOM(step)) == ROLN_E_NOT_SPD);
}

#ifdef ROLN_DOUBLE
/* A and B of a model against differences of NAME_step. */
static void check_linear(const model *of, uint64_t *seed)
{
    static double A[MAXOUT], B[2 * MAXOUT];
    const instance m = trained(of, of->md->lnn.angles ? &with_angles : &scale, theta_k);
    const int n = of->n, n2 = 2 * n, F = of->force_size;
    double x[64], y[64], z[64], r[4][64], h = 1e-3, top;
    int i, j, p;
    dyadic(n2 + F, 1, seed, x);
    memcpy(z, x, sizeof z), memcpy(y, x, sizeof y);
    CHECK_OK(m.of->linear(&m, z, z + n, x + n2, dt / 8, A, B, spare));
    CHECK(m.of->step(&m, y, y + n, x + n2, dt / 8, spare) == ROLN_OK && same(n2, y, z)); /* advances like a step */
    top = (double)largest(n2 * n2, A);
    for (j = 0; j < n2 + F; j++) {
        const double was = x[j];
        for (p = 0; p < 4; p++) {
            x[j] = was + shift[p] * h;
            memcpy(r[p], x, sizeof x);
            CHECK_OK(m.of->step(&m, r[p], r[p] + n, x + n2, dt / 8, spare));
        }
        x[j] = was;
        for (i = 0; i < n2; i++)
            BOUND("linearisation", fabs(SLOPE(r, i, h) - (j < n2 ? A[i * n2 + j] : B[i * F + j - n2])) / top, 1e-8);
    }
    CHECK(largest(n2 * F, B) > 0);
}

/* Every integrator, tau and u. */
static void test_linear(int k)
{
    uint64_t s = 250 + (uint64_t)k;
    int scheme;
    parameters(k, &s, theta_k);
    for (scheme = 0; scheme < 3; scheme++) {
        check_linear(by_tau[scheme][k], &s);
        if (models[k]->md->inputs > 0) check_linear(by_inputs[scheme][k], &s);
    }
}
#endif

void TEST_NAME(linear)(void)
{
    int k;
    for (k = 0; k < MODELS; k++) {
        test_linear_calls(k);
#ifdef ROLN_DOUBLE
        test_linear(k);
#endif
    }
    print_bounds();
}
