/* What the experiments rest on, and their headline rows: committed weights on freshly simulated trajectories. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "../unit/check.h"
#include "recipes.h"
#include "sizes.h"

/* Directions kept of the POD and of the whole space of 16. */
enum { R = 7, N = 16 };

/* A model trained in POD coordinates and the same with its first layer multiplied out say the same, and the latter's encoder is
   still the left inverse of its decoder. */
static void test_compose(void)
{
    const struct shape shape = {{R, 6, 3}, 8, ROLN_EXPONENTIAL, 0, 1, {0}, .5, 2};
    const struct stage stage = {STAGE_ACC, 300, 16, 0, 1, .05, 1e-3, 1e-2, 2, .1, 0, 1, .3, 0, 0};
    struct motion d, a;
    struct pod p;
    struct model m, b;
    double samples = 0, off = 0, inverse = 0;
    if (!CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TRAIN, 0, 2, 0, NULL) == 0) || !CHECK(pod_fit(&p, &d, R) == 0) ||
        !CHECK(motion_project(&a, &d, &p) == 0) || !CHECK(model_init(&m, &shape, &a, 3) == 0) ||
        !CHECK(model_train(&m, &a, &stage, 3, &samples) == 0) || !CHECK(model_compose(&b, &m, &p, d.mean) == 0)) return;
    CHECK(samples == 300 * 16);
    const struct predictor small = model_predictor(&m), full = model_predictor(&b);
    for (int i = 0; i < 6000; i += 500) {
        roln_real s[6], t[6], x[R], xd[R], q[N], qd[N], z[6];
        CHECK(small.encode(small.self, a.q + i * R, a.qd + i * R, s) == ROLN_OK);
        CHECK(full.encode(full.self, d.q + i * N, d.qd + i * N, t) == ROLN_OK);
        for (int k = 0; k < 6; k++)
            off = fmax(off, fabs((double)(s[k] - t[k])) / (1 + fabs((double)s[k])));
        CHECK(small.step(small.self, s, NULL, .01) == ROLN_OK && full.step(full.self, t, NULL, .01) == ROLN_OK);
        CHECK(small.decode(small.self, s, x, xd) == ROLN_OK && full.decode(full.self, t, q, qd) == ROLN_OK);
        for (int k = 0; k < R; k++) { /* W^T (q - mean) = x */
            double y = 0;
            for (int j = 0; j < N; j++)
                y += p.W[j * R + k] * (double)(q[j] - d.mean[j]);
            off = fmax(off, fabs(y - (double)x[k]));
        }
        CHECK(full.encode(full.self, q, qd, z) == ROLN_OK);
        for (int k = 0; k < 6; k++)
            inverse = fmax(inverse, fabs((double)(z[k] - t[k])) / (1 + fabs((double)t[k])));
    }
    CHECK_BELOW(off, 2e-5);
    CHECK_BELOW(inverse, 2e-5);
    model_free(&m), model_free(&b), pod_free(&p), motion_free(&a), motion_free(&d);
}

/* `value` of the line `key argument value`; -1: there is none. */
static double find(FILE *f, const char *key, const char *argument)
{
    char k[32], a[32];
    double v, value = -1;
    rewind(f);
    while (fscanf(f, "%31s %31s %lf", k, a, &v) == 3)
        if (strcmp(k, key) == 0 && strcmp(a, argument) == 0) value = v;
    return value;
}

/* measure against roln_errors, an independent route, and against sums by hand. */
static void test_measure(void)
{
    static const int ms[] = {0, 25, 100};
    const struct shape shape = {{N, 16, 16, 16, 12, 8, 4}, 64, ROLN_EXPONENTIAL, 0, 0, {0}, .6, 1};
    struct model m;
    struct motion d;
    int start[400], count = 0;
    roln_error e[2];
    FILE *f = tmpfile();
    if (!CHECK(model_load(&m, &shape, "tests/mujoco/models/pend16.roln") == 0) || !f ||
        !CHECK(motion_simulate(&d, TRUTH_PEND16, TRUTH_TEST, 0, 3, 0, NULL) == 0)) return;
    const struct predictor p = model_predictor(&m);
    CHECK(measure(&p, &d, ms, 3, f) == 0);
    for (int k = 0; k < d.count; k++)
        for (int i = 0; i + 25 < d.samples; i += 25)
            start[count++] = k * d.samples + i;
    const roln_trained t = model_trained(&m);
    const roln_batch b = {.count = count, .steps = 25, .stride = 1, .start = start, .q = d.q, .qd = d.qd};
    const struct sizes sz = sizes_of(&m.md, 16);
    roln_real *work = calloc((size_t)ROLN_ERRORS_WORK(SZ, 16), sizeof *work);
    CHECK(work && roln_errors(&t, &b, ROLN_C(1e-3), 16, 25, d.mean, e, work) == ROLN_OK);
    CHECK_NEAR(find(f, "E_q", "25"), 100 * sqrt((double)(e[1].q / e[1].q_var)), 1e-3);
    CHECK_NEAR(find(f, "E_qd", "25"), 100 * sqrt((double)(e[1].qd / e[1].qd_var)), 1e-3);
    CHECK(find(f, "E_q", "0") > 0 && find(f, "E_q", "0") < find(f, "E_q", "25") && find(f, "E_q", "100") > find(f, "E_q", "25"));
    CHECK_BELOW(find(f, "drift", "own"), .01);
    CHECK_BELOW(find(f, "drift", "own"), find(f, "drift", "true"));
    CHECK(find(f, "failed", "25") == -1 && find(f, "us", "step") > 0 && find(f, "trivial", "25") > find(f, "E_q", "25"));
    fclose(f), free(work), motion_free(&d), model_free(&m);
}

/* Every run has a recipe, no two recipes one name, and a parent comes before its children. */
static void test_recipes(void)
{
    int seed;
    for (int i = 0; i < recipes_count; i++) {
        char run[64];
        snprintf(run, sizeof run, "%s-%d", recipes[i].name, recipes[i].seeds);
        CHECK(recipe_of_run(run, &seed) == &recipes[i] && seed == recipes[i].seeds);
        snprintf(run, sizeof run, "%s-%d", recipes[i].name, recipes[i].seeds + 1);
        CHECK(recipe_of_run(run, &seed) == NULL);
        CHECK(!recipes[i].parent || (recipe_of(recipes[i].parent) && recipe_of(recipes[i].parent) < &recipes[i] &&
                                     recipe_of(recipes[i].parent)->seeds >= recipes[i].seeds));
    }
}

/* Committed weights: bounds in percent of E_q at 25 ms, at 1 s (0: no windows of that length) and of whole trajectories. */
static const struct {
    const char *run;
    double near, far, whole;
} headline[] = {
    {"pend2-exp-acc-1", .006, 3, 5}, {"pend16-acc-1", .5, 25, 35}, {"pend16-ode-1", .5, 25, 35}, {"pend16-long-1", .5, 11, 11},
    {"rope-n10-1", .3, 0, 3}, {"cloth-n10-1", 1, 0, 1.5}, {"cloth-free-n10-1", .6, 0, 1},
};

/* The model with its autoencoder stored for flash: one row of a table, with bounds in percent. The range for which it is rounded
   is that of three training trajectories. */
static void stored(const struct recipe *e, const struct model *m, const struct motion *d, const roln_storage *storage, double near,
                   double whole)
{
    static const int ms[] = {0, 25};
    const int n = m->md.lnn.n;
    struct model s = *m;
    struct motion train;
    roln_real range[3 * LATENT_MOST];
    roln_trained full = model_trained(m);
    roln_status st;
    FILE *f = tmpfile();
    if (!CHECK(f) || !CHECK(motion_simulate(&train, e->system, TRUTH_TRAIN, 0, 3, e->force, NULL) == 0)) return;
    st = roln_fit_range(&full, train.count * train.samples, train.q, train.qd, range, range + n, range + 2 * n, m->work);
    CHECK(st == ROLN_OK);
    full.z_min = range, full.z_max = range + n, full.zd_max = range + 2 * n;
    s.md.ae.storage = storage, s.params = roln_params(&s.md);
    const struct sizes sz = sizes_of(&s.md, 1);
    roln_real *work = malloc((size_t)ROLN_AE_STORE_WORK(SZ) * sizeof *work);
    s.theta = malloc((size_t)s.params * sizeof *s.theta);
    if (CHECK(work && s.theta && roln_store(&s.md, &full, s.theta, work) == ROLN_OK)) {
        const struct predictor p = model_predictor(&s);
        CHECK(measure(&p, d, ms, 2, f) == 0);
        printf("  stored %s %6d bytes of flash, autoencoder %6d; E_q 0 ms %.3f, 25 ms %.3f, whole %.3f\n",
               storage->bits == 8 ? "int8" : "half", (int)sizeof *s.theta * (3 + 3 * n + s.params),
               (int)sizeof *s.theta * sz.ae_size, find(f, "E_q", "0"), find(f, "E_q", "25"), find(f, "E_q", "whole"));
        CHECK_BELOW(find(f, "E_q", "25"), near);
        CHECK_BELOW(find(f, "E_q", "whole"), whole);
    }
    fclose(f), free(work), free(s.theta), motion_free(&train);
}

static void test_headline(void)
{
    static const int ms[] = {0, 25, 100, 1000};
    for (size_t i = 0; i < sizeof headline / sizeof *headline; i++) {
        int seed;
        const struct recipe *e = recipe_of_run(headline[i].run, &seed);
        struct shape shape;
        struct model m;
        struct motion d;
        char path[128];
        FILE *f = tmpfile();
        if (!CHECK(e && f)) return;
        shape = e->shape;
        if (e->pod > 0) shape.ae[0] = truth_dof(e->system);
        snprintf(path, sizeof path, "tests/experiments/weights/%s.roln", headline[i].run);
        if (!CHECK(model_load(&m, &shape, path) == 0) ||
            !CHECK(motion_simulate(&d, e->system, TRUTH_TEST, 0, TESTS, e->force, NULL) == 0)) return;
        const struct predictor p = model_predictor(&m);
        CHECK(measure(&p, &d, ms, 4, f) == 0);
        printf("%-16s E_q 0 ms %.3f, 25 ms %.3f, 100 ms %.3f, ", headline[i].run, find(f, "E_q", "0"), find(f, "E_q", "25"),
               find(f, "E_q", "100"));
        if (headline[i].far > 0) printf("1 s %.2f, ", find(f, "E_q", "1000"));
        printf("whole %.3f, E_qd 25 ms %.2f %%; q + h qd at 25 ms %.2f %%\n", find(f, "E_q", "whole"), find(f, "E_qd", "25"),
               find(f, "trivial", "25"));
        CHECK_BELOW(find(f, "E_q", "25"), headline[i].near);
        CHECK_BELOW(find(f, "E_q", "whole"), headline[i].whole);
        if (headline[i].far > 0) CHECK_BELOW(find(f, "E_q", "1000"), headline[i].far);
        if (strcmp(headline[i].run, "cloth-free-n10-1") == 0) {
            printf("  stored full %6d bytes of flash, autoencoder %6d\n", (int)sizeof(roln_real) * (3 + 3 * m.md.lnn.n + m.params),
                   (int)sizeof(roln_real) * roln_ae_params(&m.md.ae));
            stored(e, &m, &d, &roln_half, .6, 1);
            stored(e, &m, &d, &roln_int8, 1.3, 1.5);
        }
        fclose(f), motion_free(&d), model_free(&m);
    }
}

int main(void)
{
    test_recipes();
    test_compose();
    test_measure();
    test_headline();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
