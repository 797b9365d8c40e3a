/* experiment.c - the run list, and one run of it.

     experiment list                 run, its parent or -, trajectories simulated for training, system
     experiment run NAME DIR         trains, measures; writes DIR/NAME.roln and, when it is done, DIR/NAME.txt;
                                     of rope and cloth DIR/NAME.path; goes on where it was stopped
     experiment measure NAME DIR     measures DIR/NAME.roln again

   A run is a recipe with a seed; the recipes stand in recipes.c. Training uses one core and no validation: what
   counts are the last weights. Test trajectories are the first ten of the test stream, the same for all. */
#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "experiment.h"
#include "recipes.h"

/* ---- what a run leaves in memory ---- */

struct result {
    const struct recipe *recipe;
    struct model model;       /* of the full coordinates; of a latent baseline: its autoencoder */
    struct baseline baseline; /* no latent: not a baseline */
    struct opinf *opinf;
    double samples, seconds;  /* of training */
    double before;            /* seconds of processes that this one goes on from */
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

static int load_parent(struct result *r, const char *dir, int seed)
{
    const struct recipe *parent = recipe_of(r->recipe->parent);
    struct shape shape = parent->shape;
    char path[512];
    if (parent->pod > 0) {
        fprintf(stderr, "%s: a parent in POD coordinates\n", parent->name);
        return -1;
    }
    snprintf(path, sizeof path, "%s/%s-%d.txt", dir, parent->name, seed);
    r->samples = 1e6 * recall(path, "samples", "million"), r->seconds = recall(path, "seconds", "train");
    if (r->samples <= 0) return fprintf(stderr, "%s: not there, run it first\n", path), -1;
    snprintf(path, sizeof path, "%s/%s-%d.roln", dir, parent->name, seed);
    if (model_load(&r->model, &shape, path) != 0) return -1;
    if (r->recipe->fresh) model_restart(&r->model, &shape, (uint64_t)seed), r->samples = r->seconds = 0;
    return 0;
}

/* After every stage its weights and cost go to DIR/NAME.stage and .stage.roln: a run that was stopped goes on behind the last
   one, with the same bits. resume returns the number of stages done. */
static int resume(struct result *r, struct model *m, const char *stage)
{
    struct shape shape = r->recipe->shape;
    char weights[600];
    const int done = (int)recall(stage, "stages", "done");
    snprintf(weights, sizeof weights, "%s.roln", stage);
    if (done == 0 || model_load(m, &shape, weights) != 0) return 0;
    r->samples = recall(stage, "samples", "all"), r->seconds = recall(stage, "seconds", "train");
    r->before = recall(stage, "seconds", "all");
    return done;
}

static int keep(const struct result *r, const struct model *m, const char *stage, int done)
{
    char weights[600];
    snprintf(weights, sizeof weights, "%s.roln", stage);
    remove(stage);
    if (model_save(m, weights) != 0) return -1;
    FILE *f = fopen(stage, "w");
    if (!f) return perror(stage), -1;
    fprintf(f, "stages done %d\nsamples all %.17g\nseconds train %.17g\nseconds all %.17g\n", done, r->samples, r->seconds,
            r->before + cpu_seconds());
    return fclose(f) != 0 ? -1 : 0;
}

static void forget(const char *stage)
{
    char weights[600];
    snprintf(weights, sizeof weights, "%s.roln", stage);
    remove(stage), remove(weights);
}

/* A mechanical model: in POD coordinates where the recipe says so, from its parent's weights or from POD; stage by stage. */
static int train_stages(struct result *r, const struct motion *d, const char *dir, const char *stage, int seed)
{
    const struct recipe *e = r->recipe;
    struct motion a = *d;
    struct pod pod;
    struct model small;
    int k;
    if (e->pod > 0 && (pod_fit(&pod, d, e->pod) != 0 || motion_project(&a, d, &pod) != 0)) return -1;
    k = resume(r, &small, stage);
    if (k == 0 && e->parent) {
        if (load_parent(r, dir, seed) != 0) return -1;
        small = r->model;
    } else if (k == 0 && model_init(&small, &e->shape, &a, (uint64_t)seed) != 0) return -1;
    for (; k < STAGES && e->stage[k].updates > 0; k++) {
        const double t0 = cpu_seconds();
        struct motion b = a;
        if (e->stage[k].smooth > 0 && motion_smooth(&b, &a, e->stage[k].smooth) != 0) return -1;
        if (model_train(&small, &b, &e->stage[k], (uint64_t)(1000 * seed + k), &r->samples) != 0) return -1;
        if (e->stage[k].smooth > 0) motion_free(&b);
        r->seconds += cpu_seconds() - t0;
        if (keep(r, &small, stage, k + 1) != 0) return -1;
    }
    r->model = small;
    if (e->pod > 0) {
        if (model_compose(&r->model, &small, &pod, d->mean) != 0) return -1;
        model_free(&small), pod_free(&pod), motion_free(&a);
    }
    r->params = r->model.params;
    return 0;
}

static int train(struct result *r, const struct motion *d, const char *dir, const char *stage, int seed)
{
    const struct recipe *e = r->recipe;
    if (e->kind == LAGRANGE) return train_stages(r, d, dir, stage, seed);
    if (e->kind == LATENT && load_parent(r, dir, seed) != 0) return -1;
    r->samples = 0;
    const double t0 = cpu_seconds();
    if (e->kind == LATENT) {
        r->baseline.model = &r->model;
        if (baseline_train(&r->baseline, e->latent, d, e->stage, (uint64_t)seed, &r->samples) != 0) return -1;
        r->params = roln_ae_params(&r->model.md.ae) + latent_params(r->baseline.latent);
    } else if (e->kind != FIT) {
        if (opinf_fit(&r->opinf, e->kind == OPINF_AFFINE, e->n, d) != 0) return -1;
        r->params = opinf_params(r->opinf);
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
    if (measure(&p, test, ms, sizeof ms / sizeof *ms, out) != 0) return -1;
    return r->recipe->kind == LAGRANGE ? mechanics(&r->model, test, out) : 0;
}

/* The weights of a run; after training in POD coordinates they are those of the full ones. */
static int load(struct result *r, const char *path)
{
    struct shape shape = r->recipe->shape;
    if (r->recipe->pod > 0) shape.ae[0] = truth_dof(r->recipe->system);
    if (r->recipe->kind != LAGRANGE) return fprintf(stderr, "%s: keeps no weights, run it again\n", r->recipe->name), -1;
    if (model_load(&r->model, &shape, path) != 0) return -1;
    r->params = r->model.params;
    return 0;
}

/* What is learned in a part of the range is tested in all of it. */
static enum truth_system tested_on(const struct recipe *e)
{
    return e->system == TRUTH_PEND16_NARROW ? TRUTH_PEND16 : e->system;
}

static int run(const char *name, const char *dir, int again)
{
    struct result r;
    struct motion d, test;
    char text[512], part[512], stage[512], weights[512], path[512];
    double all = 0;
    int seed;
    memset(&r, 0, sizeof r);
    if (!(r.recipe = recipe_of_run(name, &seed))) return fprintf(stderr, "no run %s\n", name), -1;
    snprintf(text, sizeof text, "%s/%s.txt", dir, name);
    snprintf(part, sizeof part, "%s/%s.part", dir, name);
    snprintf(stage, sizeof stage, "%s/%s.stage", dir, name);
    snprintf(weights, sizeof weights, "%s/%s.roln", dir, name);
    snprintf(path, sizeof path, "%s/%s.path", dir, name);
    if (motion_simulate(&d, r.recipe->system, TRUTH_TRAIN, 0, r.recipe->train, r.recipe->force, NULL) != 0 ||
        motion_simulate(&test, tested_on(r.recipe), TRUTH_TEST, 0, TESTS, r.recipe->force, d.mean) != 0) return -1;
    if (tested_on(r.recipe) == TRUTH_PEND16 || tested_on(r.recipe) == TRUTH_WAVE16) leave_out_wild(&d);
    if (again) {
        if (load(&r, weights) != 0) return -1;
        r.seconds = recall(text, "seconds", "train"), r.samples = 1e6 * recall(text, "samples", "million");
        all = recall(text, "seconds", "all");
    } else {
        if (train(&r, &d, dir, stage, seed) != 0) return -1;
        printf("trained in %.0f s\n", r.seconds);
        if (r.recipe->kind == LAGRANGE && model_save(&r.model, weights) != 0) return -1;
    }
    FILE *out = fopen(part, "w");
    if (!out) return perror(part), -1;
    fprintf(out, "run %s 1\ntrajectories train %d\nparameters all %d\nsamples million %.4g\nseconds train %.4g\n", name, d.count,
            r.params, 1e-6 * r.samples, r.seconds);
    if (r.recipe->kind == FIT ? fit_measure(&d, &test, out) : measure_all(&r, &test, out) || draw(&r, &test, path)) return -1;
    fprintf(out, "seconds all %.4g\n", again ? all : r.before + cpu_seconds());
    if (fclose(out) != 0 || rename(part, text) != 0) return -1;
    forget(stage);
    return 0;
}

int main(int argc, char **argv)
{
    if (argc == 2 && strcmp(argv[1], "list") == 0) return recipes_list(), 0;
    if (argc == 4 && strcmp(argv[1], "run") == 0) return run(argv[2], argv[3], 0) != 0;
    if (argc == 4 && strcmp(argv[1], "measure") == 0) return run(argv[2], argv[3], 1) != 0;
    fprintf(stderr, "usage: experiment list | run NAME DIR | measure NAME DIR\n");
    return 2;
}
