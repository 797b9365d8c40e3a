/* SPDX-License-Identifier: MIT */
/* main.c - runs the test files, each as float and as double, with -DALONE=f32 or -DALONE=f64 as one of them. Arguments: names to
   run; none: all. `sample` before them: sweeps over millions of numbers take a sample. */
#include <string.h>
#include <time.h>

#include "check.h"

#define FILES(X) \
    X(elementary) X(dense) X(eig) X(spd) X(riccati) X(ocp) X(ae) X(ae_stored) X(chart) X(chart_model) X(lnn) X(lnn_motion) \
    X(lnn_edges) X(riem) X(newton) X(newton_model) X(lbfgs) X(roln) X(gradient) X(rows) X(measures) X(pack) X(scratch) \
    X(scratch_training) X(units) X(units_control) X(units_training) X(control) X(linear) X(feedback) X(tick) X(guard) \
    X(limits) X(delay) X(filter) X(noise) X(plan) X(robust) X(safety) X(edges) X(sums) \
    X(actuator) X(driven) X(stiction) X(stiction_model) X(observer) X(doubt)
#define DECLARE(name) void test_##name##_f32(void); void test_##name##_f64(void);
#define ENTRY(name, alone) ENTRY_(name, alone)
#define ENTRY_(name, alone) {#name, test_##name##_##alone, #alone},
#ifdef ALONE
#define ENTRIES(name) ENTRY(name, ALONE)
#else
#define ENTRIES(name) ENTRY(name, f32) ENTRY(name, f64)
#endif

FILES(DECLARE)

static const struct {
    const char *name;
    void (*run)(void);
    const char *precision;
} tests[] = {FILES(ENTRIES)};

int main(int argc, char **argv)
{
    size_t i;
    int a;
    if (argc > 1 && strcmp(argv[1], "sample") == 0) {
        check_sample = 1;
        argc--;
        argv++;
    }
    for (a = 1; a < argc; a++) { /* a name that is none would test nothing */
        for (i = 0; i < sizeof tests / sizeof *tests && strcmp(argv[a], tests[i].name) != 0; i++) {}
        if (i == sizeof tests / sizeof *tests) return printf("no test %s\n", argv[a]), 2;
    }
    for (i = 0; i < sizeof tests / sizeof *tests; i++) {
        const long passed = check_passed, failed = check_failed;
        const clock_t start = clock();
        int wanted = argc < 2;
        for (a = 1; a < argc; a++)
            wanted |= strcmp(argv[a], tests[i].name) == 0;
        if (!wanted) continue;
        tests[i].run();
        printf("%-18s %s %8ld passed, %ld failed, %.1f s\n", tests[i].name, tests[i].precision, check_passed - passed,
               check_failed - failed, (double)(clock() - start) / CLOCKS_PER_SEC);
        fflush(stdout);
    }
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
