/* Closed loops: a model trained on recordings alone controls MuJoCo's chain along references it has never followed. */
#include "../check.h"
#include "control.h"

void test_control(void);

#define STEPS 60000

static void test_reference(struct control_model *m, const struct control_gains *g, int number)
{
    const struct control_reference ref = control_reference((uint64_t)number);
    struct control_result r[CONTROL_LAWS];
    printf("reference %d\n", number);
    for (int law = 0; law < CONTROL_LAWS; law++) {
        CHECK(control_run(m, &ref, (enum control_law)law, g, STEPS, &r[law], NULL) == 0);
        control_row((enum control_law)law, &r[law], &r[law == CONTROL_LATENT_4 ? CONTROL_PD_4 : 0]);
        CHECK(r[law].bad == 0);
        CHECK_BELOW(r[law].late, 2 * r[law].early);
    }
    CHECK(r[CONTROL_LATENT].outside == 0 && r[CONTROL_LATENT_4].outside == 0);
    CHECK_BELOW(r[CONTROL_LATENT].rms, r[CONTROL_PD].rms / 5);
    CHECK_BELOW(r[CONTROL_LATENT].rms, r[CONTROL_PD_GRAVITY].rms);
    CHECK_BELOW(r[CONTROL_LATENT_4].rms, r[CONTROL_PD_4].rms / 5);
}

void test_control(void)
{
    struct control_model *m = control_load(CONTROL_MODEL);
    struct control_gains g;
    if (!CHECK(m != NULL)) return;
    if (CHECK(control_gains(m, 10, 1, &g) == 0)) {
        printf("closed loops, 60 s at 1 kHz, w = 10 rad/s\n");
        control_heading();
        for (int number = 1; number <= CONTROL_REFERENCES; number++) test_reference(m, &g, number);
    }
    control_free(m);
}
