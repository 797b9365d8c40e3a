/* SPDX-License-Identifier: MIT */
/* experiment.c - the run list, and one run of it.

     experiment list                 run, trajectories simulated for training, system
     experiment configs              run, row of configs.h, which build/experiment_ROW has and this program may lack
     experiment run NAME DIR         trains, measures; writes DIR/NAME.roln and, when it is done, DIR/NAME.txt;
                                     of rope and cloth DIR/NAME.path
     experiment measure NAME DIR     measures DIR/NAME.roln again
     experiment tune NAME DIR SECONDS    as run for so long, on the trajectories on which settings are chosen

   A run is a recipe with a seed; the recipes stand in recipes.c. Training uses one core for so many seconds and no validation:
   what counts are the last weights. Test trajectories are the first ten of the test stream, the same for all; of the tune stream
   likewise, but for wild ones. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "experiment.h"
#include "recipes.h"

/* ---- what a run leaves in memory ---- */

struct result {
    const struct recipe *recipe;
    double budget;            /* seconds of training */
    struct model model;       /* of the full coordinates; of a latent baseline: its autoencoder */
    struct baseline baseline; /* no latent: not a baseline */
    struct opinf *opinf;
    double samples, seconds; /* of training */
    int params;
};

/* ---- a run ---- */

/* Left out of training: trajectories of 16 joints in which the last block whips round (|q12| >= 2.1 rad), of 200 seven of pend16
   and four of wave16; mean: of the others. */
static void leave_out_wild(struct motion *d)
{
    int kept = 0;
    const size_t length = (size_t)d->samples * (size_t)d->N;
    roln_real *all[] = {d->q, d->qd, d->qdd, d->tau, d->tau_mid};
    for (int k = 0; k < d->count; k++) {
        int wild = 0;
        for (int i = 0; i < d->samples; i++)
            wild |= fabs((double)d->q[(size_t)k * length + (size_t)(i * d->N + 12)]) >= 2.1;
        if (wild) continue;
        for (int a = 0; a < 5; a++)
            if (all[a]) memmove(all[a] + (size_t)kept * length, all[a] + (size_t)k * length, length * sizeof *all[a]);
        kept++;
    }
    d->count = kept;
    for (int j = 0; j < d->N; j++) {
        double sum = 0;
        for (size_t i = (size_t)j; i < (size_t)kept * length; i += (size_t)d->N)
            sum += (double)d->q[i];
        d->mean[j] = (roln_real)(sum / (double)(kept * d->samples));
    }
}

/* `value` of the line `key argument value` of a result. */
static double recall(const char *path, const char *key, const char *argument)
{
    char k[32], a[32];
    double value = 0, v;
    FILE *f = fopen(path, "r");
    while (f && fscanf(f, "%31s %31s %lf", k, a, &v) == 3)
        if (strcmp(k, key) == 0 && strcmp(a, argument) == 0) value = v;
    if (f) fclose(f);
    return value;
}

/* A mechanical or latent model: in POD coordinates where the recipe says so, stage by stage. What a stage leaves of its seconds is
   the next one's. t0: when it all began. */
static int train_stages(struct result *r, const struct motion *d, int seed, double t0)
{
    const struct recipe *e = r->recipe;
    struct motion a = *d;
    struct pod pod;
    double part = 0;
    if (e->pod > 0 && (pod_fit(&pod, d, e->pod) != 0 || motion_project(&a, d, &pod) != 0)) return -1;
    if (model_init(&r->model, e->model, e->zoom > 0 ? e->zoom : 1, &a, (uint64_t)seed) != 0) return -1;
    if (e->kind == LATENT) r->baseline.model = &r->model;
    for (int k = 0; k < STAGES && e->stage[k].part > 0; k++) {
        const struct stage *s = &e->stage[k];
        const uint64_t draws = (uint64_t)(1000 * seed + k);
        struct motion b = a;
        part += s->part;
        if (s->smooth > 0 && motion_smooth(&b, &a, s->smooth) != 0) return -1;
        const double seconds = part * r->budget - (cpu_seconds() - t0);
        if (e->kind == LATENT && s->kind == STAGE_NEWTON
                ? baseline_train(&r->baseline, e->latent, &b, s, seconds, draws, &r->samples) != 0
                : model_train(&r->model, &b, s, seconds, draws, &r->samples) != 0)
            return -1;
        if (s->smooth > 0) motion_free(&b);
    }
    model_finish(&r->model);
    if (e->pod > 0) {
        struct model small = r->model;
        if (model_compose(&r->model, &small, e->whole, &pod, d->mean) != 0) return -1;
        model_free(&small), pod_free(&pod), motion_free(&a);
    }
    r->params = e->kind == CHART ? r->model.kind->front : r->model.kind->params;
    return 0;
}

static int train(struct result *r, const struct motion *d, int seed)
{
    const struct recipe *e = r->recipe;
    const double t0 = cpu_seconds();
    if (e->kind == LAGRANGE || e->kind == LATENT || e->kind == CHART) {
        if (train_stages(r, d, seed, t0) != 0) return -1;
    } else if (e->kind != FIT) {
        if (opinf_fit(&r->opinf, e->kind == OPINF_AFFINE, e->n, d) != 0) return -1;
        r->params = opinf_params(r->opinf);
    }
    if (e->kind == LATENT) {
        baseline_finish(&r->baseline);
        r->params = r->model.kind->front + latent_params(r->baseline.latent);
    }
    r->seconds = cpu_seconds() - t0;
    return 0;
}

static struct predictor predictor_of(struct result *r)
{
    struct predictor p;
    if (r->baseline.latent) return baseline_predictor(&r->baseline);
    if (!r->opinf) return model_predictor(&r->model);
    p = opinf_predictor(r->opinf);
    if (r->recipe->kind == OPINF_AFFINE) p.energy = NULL; /* it has damping */
    return p;
}

/* DIR/NAME.path, for the pictures of rope and cloth. */
static int draw(struct result *r, const struct motion *test, const char *path)
{
    const struct predictor p = predictor_of(r);
    int columns, rows, bad;
    if (truth_grid(test->system, &columns, &rows) != 0) return 0;
    FILE *out = fopen(path, "w");
    if (!out) return perror(path), -1;
    bad = measure_path(&p, test, out);
    return fclose(out) != 0 || bad ? -1 : 0;
}

/* Windows of the ODE loss last 40 ms: 400 ms and 2 s are 10 and 50 times as long. */
static int measure_all(struct result *r, const struct motion *test, FILE *out)
{
    static const int ms[] = {0, 1, 2, 3, 5, 25, 100, 250, 400, 500, 1000, 2000};
    const struct predictor p = predictor_of(r);
    if (r->recipe->kind == CHART) return measure_chart(&p, test, out);
    if (measure(&p, test, ms, sizeof ms / sizeof *ms, out) != 0) return -1;
    return r->recipe->kind == LAGRANGE ? mechanics(&r->model, test, out) : 0;
}

static int load(struct result *r, const char *path)
{
    if (r->recipe->kind != LAGRANGE) return fprintf(stderr, "%s: keeps no weights, run it again\n", r->recipe->name), -1;
    if (model_load(&r->model, recipe_weights(r->recipe), path) != 0) return -1;
    r->params = r->model.kind->params;
    return 0;
}

/* What is learned in a part of the range is tested in all of it. */
static enum truth_system tested_on(const struct recipe *e)
{
    return e->system == TRUTH_PEND16_NARROW ? TRUTH_PEND16 : e->system;
}

enum order { RUN, MEASURE, TUNE };

/* Motion for training and for the errors. */
static int simulate(const struct recipe *e, enum order order, struct motion *d, struct motion *test)
{
    const enum truth_system where = tested_on(e);
    const int tests = e->tests > 0 ? e->tests : TESTS, wild = where == TRUTH_PEND16 || where == TRUTH_WAVE16;
    if (motion_simulate(d, e->system, TRUTH_TRAIN, e->recorded, e->train, e->force, NULL) != 0 ||
        motion_simulate(test, where, order == TUNE ? TRUTH_TUNE : TRUTH_TEST, e->recorded, tests, e->force, d->mean) != 0)
        return -1;
    if (wild) leave_out_wild(d);
    if (wild && order == TUNE) leave_out_wild(test);
    return 0;
}

/* budget: seconds of training; 0: as the recipe has them. */
static int run(const char *name, const char *dir, enum order order, double budget)
{
    struct result r;
    struct motion d, test;
    const time_t now = time(NULL);
    char text[512], part[512], weights[512], path[512], day[16];
    double all = 0;
    int seed;
    memset(&r, 0, sizeof r);
    if (!(r.recipe = recipe_of_run(name, &seed))) return fprintf(stderr, "no run %s\n", name), -1;
    if (r.recipe->config && !r.recipe->model)
        return fprintf(stderr, "%s: build/experiment_%s has it\n", name, r.recipe->config), -1;
    r.budget = budget > 0 ? budget : r.recipe->seconds;
    snprintf(text, sizeof text, "%s/%s.txt", dir, name);
    snprintf(part, sizeof part, "%s/%s.part", dir, name);
    snprintf(weights, sizeof weights, "%s/%s.roln", dir, name);
    snprintf(path, sizeof path, "%s/%s.path", dir, name);
    if (simulate(r.recipe, order, &d, &test) != 0) return -1;
    if (order == MEASURE) {
        if (load(&r, weights) != 0) return -1;
        r.seconds = recall(text, "seconds", "train"), r.samples = 1e6 * recall(text, "samples", "million");
        all = recall(text, "seconds", "all");
    } else {
        if (train(&r, &d, seed) != 0) return -1;
        printf("trained in %.1f s\n", r.seconds);
        if (r.recipe->kind == LAGRANGE && model_save(&r.model, weights) != 0) return -1;
    }
    FILE *out = fopen(part, "w");
    if (!out) return perror(part), -1;
    strftime(day, sizeof day, "%Y%m%d", localtime(&now));
    fprintf(out, "run %s %s\ntrajectories train %d\nparameters all %d\nsamples million %.4g\nseconds train %.4g\n", name, day,
            d.count, r.params, 1e-6 * r.samples, r.seconds);
    if (r.recipe->kind == FIT ? fit_measure(&d, &test, out)
                              : measure_all(&r, &test, out) || (r.recipe->kind != CHART && draw(&r, &test, path)))
        return -1;
    fprintf(out, "seconds all %.4g\n", order == MEASURE ? all : cpu_seconds());
    return fclose(out) != 0 || rename(part, text) != 0 ? -1 : 0;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "list") == 0) return recipes_list(), 0;
    if (argc == 2 && strcmp(argv[1], "configs") == 0) return recipes_configs(), 0;
    if (argc == 4 && strcmp(argv[1], "run") == 0) return run(argv[2], argv[3], RUN, 0) != 0;
    if (argc == 4 && strcmp(argv[1], "measure") == 0) return run(argv[2], argv[3], MEASURE, 0) != 0;
    if (argc == 5 && strcmp(argv[1], "tune") == 0) return run(argv[2], argv[3], TUNE, atof(argv[4])) != 0;
    fprintf(stderr, "usage: experiment list | configs | run NAME DIR | measure NAME DIR | tune NAME DIR SECONDS\n");
    return 2;
}
