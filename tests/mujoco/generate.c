/* SPDX-License-Identifier: MIT */
/* generate - writes a ground-truth set.
     generate SYSTEM OUT.h5 [--csv PREFIX] [--train N] [--test N] [--tune N] [--seed S] [--starts FILE]
                                             N = 100 (rope, cloth 60), 10 and 10, S = 1. FILE is OUT_next.csv of train.c: pendulums
                                             are trained from these starts, and N counts for nothing
     generate --export IN.h5 PREFIX          PREFIX_train.csv, PREFIX_test.csv, PREFIX_tune.csv from an existing file
   Settings are chosen on tune, so that test stays unseen until they stand. */
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "demos.h"
#include "h5.h"

static int usage(void)
{
    fprintf(stderr, "generate SYSTEM OUT.h5 [--csv PREFIX] [--train N] [--test N] [--tune N] [--seed S] "
                    "[--starts FILE]\ngenerate --export IN.h5 PREFIX\nSYSTEM:");
    for (int i = 0; i < TRUTH_SYSTEMS; i++) fprintf(stderr, " %s", truth_name((enum truth_system)i));
    fputc('\n', stderr);
    return 2;
}

static int export_csv(const struct truth_set sets[TRUTH_SPLITS], const char *prefix)
{
    char path[4096];
    for (int i = 0; i < TRUTH_SPLITS; i++) {
        if (snprintf(path, sizeof path, "%s_%s.csv", prefix, truth_split_name((enum truth_split)i)) >= (int)sizeof path) return -1;
        if (truth_csv(&sets[i], path)) return -1;
    }
    return 0;
}

static void release(struct truth_set sets[TRUTH_SPLITS])
{
    for (int i = 0; i < TRUTH_SPLITS; i++) truth_free(&sets[i]);
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

/* --train, --test or --tune; -1: another word. */
static int split_of(const char *option)
{
    for (int i = 0; i < TRUTH_SPLITS; i++)
        if (!strncmp(option, "--", 2) && !strcmp(option + 2, truth_split_name((enum truth_split)i))) return i;
    return -1;
}

/* q of the first sample of each recording of a file: starts [count][dof]. Returns count, 0: the file is none, or has more than
   `most`. */
static int read_starts(const char *path, int dof, int most, double *starts)
{
    demos d = {.N = dof};
    const int count = demos_read_csv(&d, path) || d.count > most ? 0 : d.count;
    for (int k = 0; k < count; k++) memcpy(starts + k * dof, d.demo[k].row + 1, (size_t)dof * sizeof *starts);
    demos_free(&d);
    return count;
}

int main(int argc, char **argv)
{
    static double starts[1000 * 16];
    const char *from = NULL;
    struct truth_set sets[TRUTH_SPLITS] = {{0}};
    enum truth_system system;
    const char *csv = NULL;
    int count[TRUTH_SPLITS] = {[TRUTH_TRAIN] = 100, [TRUTH_TEST] = 10, [TRUTH_TUNE] = 10}, bad = 0;
    uint64_t seed = 1;

    if (argc == 4 && !strcmp(argv[1], "--export")) {
        if (truth_h5_read(argv[2], sets)) return 1;
        bad = export_csv(sets, argv[3]);
        release(sets);
        return bad != 0;
    }
    if (argc < 3 || argc % 2 == 0 || truth_find(argv[1], &system)) return usage();
    if (system == TRUTH_ROPE || system == TRUTH_CLOTH) count[TRUTH_TRAIN] = 60; /* half a gigabyte */
    for (int i = 3; i < argc; i += 2) {
        const int split = split_of(argv[i]);
        if (split >= 0) count[split] = atoi(argv[i + 1]);
        else if (!strcmp(argv[i], "--csv")) csv = argv[i + 1];
        else if (!strcmp(argv[i], "--starts")) from = argv[i + 1];
        else if (!strcmp(argv[i], "--seed")) seed = strtoull(argv[i + 1], NULL, 0);
        else return usage();
    }
    if (from) {
        const int dof = truth_dof(system);
        if (dof > 16) return usage();
        count[TRUTH_TRAIN] = read_starts(from, dof, 1000, starts);
    }
    for (int i = 0; i < TRUTH_SPLITS; i++)
        if (count[i] < 1) return usage();

    for (int i = 0; i < TRUTH_SPLITS && !bad; i++) {
        const enum truth_split split = (enum truth_split)i;
        bad = (from && split == TRUTH_TRAIN
                   ? truth_generate_from(&sets[i], system, seed, count[i], truth_samples(system), starts)
                   : truth_generate(&sets[i], system, split, seed, 0, count[i], truth_samples(system)))
            || summary(truth_split_name(split), &sets[i]);
    }
    bad = bad || truth_h5_write(argv[2], sets) || (csv && export_csv(sets, csv));
    release(sets);
    return bad;
}
