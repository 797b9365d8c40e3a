/* SPDX-License-Identifier: MIT */
/* Closed loops: a model trained on recordings alone controls MuJoCo's chain along references it has never followed. */
#include <math.h>
#include <string.h>

#include "../unit/check.h"
#include "../control/control.h"
#include "truth.h"

void test_control(void);

#define STEPS 60000

/* Left alone the plant moves as TRUTH_PEND16_SOFT, bit for bit; J^T g = dV/dz. */
static void test_plant(void)
{
    const double h = 1e-4, z[4] = {.3, -.4, .2, .45}, none[16] = {0};
    struct truth_set s;
    struct truth_plant *p;
    double q[16], qd[16], g[16], J[64], M[16], V[2];
    if (!CHECK(truth_generate(&s, TRUTH_PEND16_SOFT, TRUTH_TEST, 1, 0, 1, 300) == 0)) return;
    if (CHECK(truth_plant_open(&p, s.q, s.qd) == 0)) {
        for (int k = 1; k < s.samples; k++) CHECK(truth_plant_step(p, none) == 0);
        truth_plant_state(p, q, qd);
        CHECK(!memcmp(q, s.q + 16 * (s.samples - 1), sizeof q) && !memcmp(qd, s.qd + 16 * (s.samples - 1), sizeof qd));
        truth_plant_close(p);
    }
    truth_free(&s);
    truth_phi(TRUTH_PEND16, z, q, J);
    if (!CHECK(truth_plant_open(&p, q, none) == 0)) return;
    truth_plant_gravity(p, g);
    for (int j = 0; j < 4; j++) {
        double to[4], f = 0;
        for (int side = 0; side < 2; side++) {
            memcpy(to, z, sizeof to);
            to[j] += side ? h : -h;
            CHECK(truth_reduced(TRUTH_PEND16, to, M, &V[side]) == 0);
        }
        for (int i = 0; i < 16; i++) f += J[4 * i + j] * g[i];
        CHECK_NEAR(f, (V[1] - V[0]) / (2 * h), 1e-6);
    }
    truth_plant_close(p);
}

/* qd and qdd of a reference are the derivatives of its q; it starts at rest. */
static void test_derivatives(const struct control_reference *r)
{
    const double h = 1e-4;
    double q[3][16], qd[3][16], qdd[3][16], worst = 0;
    for (double t = .05; t < 10; t += .37) {
        for (int k = 0; k < 3; k++) control_reference_at(r, t + (k - 1) * h, q[k], qd[k], qdd[k]);
        for (int i = 0; i < 16; i++) {
            worst = fmax(worst, fabs((q[2][i] - q[0][i]) / (2 * h) - qd[1][i]));
            worst = fmax(worst, fabs((qd[2][i] - qd[0][i]) / (2 * h) - qdd[1][i]));
        }
    }
    CHECK_BELOW(worst, 1e-5);
    control_reference_at(r, 0, q[0], qd[0], qdd[0]);
    for (int i = 0; i < 16; i++) CHECK(qd[0][i] == 0);
}

static void test_reference(struct control_model *m, const struct control_gains *g, int number)
{
    const struct control_reference ref = control_reference((uint64_t)number);
    struct control_result r[CONTROL_LAWS];
    test_derivatives(&ref);
    printf("reference %d\n", number);
    for (int law = 0; law < CONTROL_LAWS; law++) {
        CHECK(control_run(m, &ref, (enum control_law)law, g, STEPS, &r[law], NULL) == 0);
        control_row((enum control_law)law, &r[law], &r[law == CONTROL_LATENT_4 ? CONTROL_PD_4 : 0]);
        CHECK(r[law].bad == 0 && r[law].faults == 0);
        CHECK_BELOW(r[law].late, 1.5 * r[law].early); /* halves of 29 s: the slowest sine has 10 s */
    }
    CHECK(r[CONTROL_LATENT].outside == 0 && r[CONTROL_LATENT_4].outside == 0);
    CHECK_BELOW(r[CONTROL_LATENT].rms, r[CONTROL_PD].rms / 50);
    CHECK_BELOW(r[CONTROL_LATENT].rms, r[CONTROL_PD_GRAVITY].rms);
    CHECK_BELOW(r[CONTROL_LATENT_4].rms, r[CONTROL_PD_4].rms / 50);
}

void test_control(void)
{
    struct control_model *m = control_load(CONTROL_MODEL);
    struct control_gains g;
    test_plant();
    if (!CHECK(m != NULL)) return;
    if (CHECK(control_gains(m, 10, 1, &g) == 0)) {
        printf("closed loops, 60 s at 1 kHz, w = 10 rad/s\n");
        control_heading();
        for (int number = 1; number <= CONTROL_REFERENCES; number++) test_reference(m, &g, number);
    }
    control_free(m);
}
