/* generate - writes a ground-truth set.
     generate SYSTEM OUT.h5 [--csv PREFIX] [--train N] [--test N] [--seed S]        N = 100 (rope, cloth 60) and 10, S = 1
     generate --export IN.h5 PREFIX          PREFIX_train.csv, PREFIX_test.csv from an existing file */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "h5.h"

static int usage(void)
{
    fprintf(stderr, "generate SYSTEM OUT.h5 [--csv PREFIX] [--train N] [--test N] [--seed S]\n"
                    "generate --export IN.h5 PREFIX\nSYSTEM:");
    for (int i = 0; i < TRUTH_SYSTEMS; i++) fprintf(stderr, " %s", truth_name((enum truth_system)i));
    fputc('\n', stderr);
    return 2;
}

static int export_csv(const struct truth_set *train, const struct truth_set *test, const char *prefix)
{
    char path[4096];
    const struct truth_set *sets[2] = {train, test};
    static const char *const suffix[2] = {"train", "test"};
    for (int i = 0; i < 2; i++) {
        if (snprintf(path, sizeof path, "%s_%s.csv", prefix, suffix[i]) >= (int)sizeof path) return -1;
        if (truth_csv(sets[i], path)) return -1;
    }
    return 0;
}

static int summary(const char *name, const struct truth_set *s)
{
    struct truth_report r;
    int columns, rows, beads = !truth_grid(s->system, &columns, &rows);
    const char *unit = beads ? "m" : "rad";
    if (truth_check(s, &r)) return -1;
    printf("%-11s %-5s %3d x %d, residual %.1e of max |tau| %.3g %s, ", truth_name(s->system), name, s->count, s->samples,
           r.residual, r.force_max, beads ? "N" : "N m");
    if (beads) printf("momentum - impulse %.1e N s", r.impulse);
    else printf("J^T(tau - tau_model) %.1e", r.ideal);
    printf(", energy - work %.1e of peak, max |q| %.2f %s, |qd| %.1f %s/s\n", r.energy, r.q_max, unit, r.qd_max, unit);
    return 0;
}

int main(int argc, char **argv)
{
    struct truth_set train, test;
    enum truth_system system;
    const char *csv = NULL;
    int train_count, test_count = 10;
    uint64_t seed = 1;

    if (argc == 4 && !strcmp(argv[1], "--export")) {
        if (truth_h5_read(argv[2], &train, &test)) return 1;
        int bad = export_csv(&train, &test, argv[3]);
        truth_free(&train);
        truth_free(&test);
        return bad != 0;
    }
    if (argc < 3 || argc % 2 == 0 || truth_find(argv[1], &system)) return usage();
    train_count = system == TRUTH_ROPE || system == TRUTH_CLOTH ? 60 : 100;     /* 60: half a gigabyte */
    for (int i = 3; i < argc; i += 2) {
        if (!strcmp(argv[i], "--csv")) csv = argv[i + 1];
        else if (!strcmp(argv[i], "--train")) train_count = atoi(argv[i + 1]);
        else if (!strcmp(argv[i], "--test")) test_count = atoi(argv[i + 1]);
        else if (!strcmp(argv[i], "--seed")) seed = strtoull(argv[i + 1], NULL, 0);
        else return usage();
    }
    if (train_count < 1 || test_count < 1) return usage();

    if (truth_generate(&train, system, TRUTH_TRAIN, seed, 0, train_count, truth_samples(system))) return 1;
    if (truth_generate(&test, system, TRUTH_TEST, seed, 0, test_count, truth_samples(system))) return 1;
    int bad = summary("train", &train) || summary("test", &test) || truth_h5_write(argv[2], &train, &test)
        || (csv && export_csv(&train, &test, csv));
    truth_free(&train);
    truth_free(&test);
    return bad;
}
