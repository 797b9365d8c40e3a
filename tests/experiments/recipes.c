/* SPDX-License-Identifier: MIT */
/* recipes.c - the run list. */
#include <stdlib.h>
#include <string.h>

#include "recipes.h"

/* ---- models: rows of configs.h. A program has some of them, those that are not there are NULL ---- */

#define ROW(x) extern const struct config x##_kind __attribute__((weak));
#define WHOLE(x) ROW(x) ROW(x##_whole)
ROW(pend2) ROW(pend2_base) ROW(pend2_gyro) ROW(pend2_base_gyro) ROW(pend2_chol) ROW(pend2_angles) ROW(pend2_poly)
ROW(full16) ROW(full16_chol)
ROW(chart16_d2) ROW(chart16_d3) ROW(chart16_d4) ROW(chart16_d5) ROW(chart16_d6) ROW(chart16_d8)
ROW(chart16_d4_chol) ROW(chart16_d6_chol) ROW(chart16_d8_chol) ROW(chart16_d4_poly) ROW(chart16_d6_poly) ROW(chart16_d8_poly)
ROW(pod16) ROW(pod16_poly) ROW(layered16)
WHOLE(rope_n4_pod) WHOLE(rope_n4_d2) WHOLE(rope_n4_d3) WHOLE(rope_n4_d4) WHOLE(rope_n4_d5) WHOLE(rope_n4_layers) WHOLE(rope_n6)
WHOLE(rope_n10_pod) WHOLE(rope_n10_d2) WHOLE(rope_n10_d3) WHOLE(rope_n10_d4) WHOLE(rope_n10_poly) WHOLE(rope_n14) WHOLE(rope_layers)
WHOLE(cloth_n4) WHOLE(cloth_n6) WHOLE(cloth_n10_pod) WHOLE(cloth_n10_d2) WHOLE(cloth_n10_d3) WHOLE(cloth_n10_d4) WHOLE(cloth_n14)
WHOLE(cloth_free_n10) WHOLE(cloth_layers) WHOLE(cloth_free_layers)

#define MODEL(x) .config = #x, .model = &x##_kind
#define POD(r, x) .pod = r, .config = #x, .model = &x##_kind, .whole = &x##_whole_kind

/* ---- stages: they share the seconds of a run ---- */

#define TURN(p) {.kind = STAGE_CHART, .part = p, .batch = 4000}
#define SINGLE(p, rows) {.kind = STAGE_NEWTON, .part = p, .batch = rows}
#define WINDOWS(p, rows, part_, H, samples, ...) \
    {.kind = STAGE_NEWTON, .part = p, .batch = rows, .share = part_, .steps = H, .stride = samples, __VA_ARGS__}
/* rows of single samples, then windows of half a second among them */
#define NEWTON(first, rows) SINGLE(.35 - first, rows), WINDOWS(.65, rows, .05, 25, 20, .last = 2)
/* the same of models without autoencoder: forces count in rows as accelerations do */
#define NEWTON_FORCES(rows) \
    {.kind = STAGE_NEWTON, .part = .35, .batch = rows, .w_force = 1}, \
        WINDOWS(.65, rows, .05, 25, 20, .w_force = 1, .last = 2)
/* 16 joints for 300 s and more: with a memory of 8 steps single samples lead astray after hundreds of them, and windows come to no
   rest */
#define NEWTON_LONG(first, rows) \
    {.kind = STAGE_NEWTON, .part = .15 - first, .batch = rows, .memory = 4}, \
        WINDOWS(.85, rows, .05, 25, 20, .memory = 4, .last = 1)
/* polynomials behind a chart, as the trainer has them: those of a short memory run away in long windows */
#define NEWTON_POLY(first) SINGLE(.35 - first, 4000), WINDOWS(.65, 4000, .05, 25, 20, .last = 8)
#define NEWTON_POLY_LONG(first) SINGLE(.15 - first, 4000), WINDOWS(.85, 4000, .05, 25, 20, .last = 8)
/* the paper's: autoencoder alone, acceleration loss, ODE loss over windows of 40 ms */
#define ADAM(kind_, p, ae, net, ...) \
    {.kind = kind_, .part = p, .batch = 64, .lr_ae = ae, .lr_net = net, .fall = 1e-3, .w_qd = 1, .bias = 1, __VA_ARGS__}
#define PAPER \
    ADAM(STAGE_AE, .07, .1, 0, .w_q = 2), ADAM(STAGE_ACC, .63, .1, 3e-3, .w_q = 2, .w_acc = .1), \
        ADAM(STAGE_ODE, .3, .03, 1e-3, .w_q = 2, .steps = 8, .stride = 5)

/* ---- pend2: 30 seconds ---- */

#define PEND2_AS(what, id, trajectories, repeats, ...) \
    {.name = "pend2-" id, .kind = what, .system = TRUTH_PEND2_ACT, .train = trajectories, .force = 1, .seeds = repeats, \
     .seconds = 30, __VA_ARGS__}
#define PEND2(id, config) PEND2_AS(LAGRANGE, id, 40, 3, MODEL(config), .stage = {NEWTON_FORCES(2000)})
#define PEND2_LATENT(id, trajectories, what) \
    PEND2_AS(LATENT, id, trajectories, 3, MODEL(pend2), .latent = what, .stage = {NEWTON(0, 2000)})
#define PEND2_FEW(trajectories) \
    PEND2_AS(LAGRANGE, "few" #trajectories "-exp", trajectories, 3, MODEL(pend2), .stage = {NEWTON_FORCES(2000)}), \
    PEND2_AS(LAGRANGE, "few" #trajectories "-chol", trajectories, 3, MODEL(pend2_chol), .stage = {NEWTON_FORCES(2000)}), \
    PEND2_AS(LAGRANGE, "few" #trajectories "-poly", trajectories, 3, MODEL(pend2_poly), .stage = {NEWTON_FORCES(2000)}), \
    PEND2_LATENT("few" #trajectories "-mlp", trajectories, LATENT_MLP)
/* joint 2 turns over in 3 recordings and in 2 of the tests */
#define TURNING(id, config) \
    PEND2_AS(LAGRANGE, "turning-" id, 40, 3, .recorded = 7, .tests = 21, MODEL(config), .stage = {NEWTON_FORCES(2000)})
/* three optimisers, one loss: accelerations of single samples */
#define OPTIMISER(id, where, trajectories, unit, time, ...) \
    {.name = id, .kind = LAGRANGE, .system = where, .train = trajectories, .force = unit, .seeds = 5, .seconds = time, __VA_ARGS__}
#define OPTIMISERS(id, where, trajectories, unit, time, ...) \
    OPTIMISER(id "-opt-newton", where, trajectories, unit, time, __VA_ARGS__, .stage = {TURN(.1), SINGLE(.9, 2000)}), \
    OPTIMISER(id "-opt-lbfgs", where, trajectories, unit, time, __VA_ARGS__, \
              .stage = {TURN(.1), {.kind = STAGE_LBFGS, .part = .9, .batch = 8000}}), \
    OPTIMISER(id "-opt-adam", where, trajectories, unit, time, __VA_ARGS__, \
              .stage = {TURN(.1), ADAM(STAGE_ACC, .9, 0, 3e-3, .w_acc = 1)})

/* ---- 16 joints: pend16, whose couplings are polynomials, and wave16, whose are not; no force does work ---- */

#define JOINTS(what, id, where, trajectories, repeats, time, ...) \
    {.name = id, .kind = what, .system = where, .train = trajectories, .seeds = repeats, .seconds = time, __VA_ARGS__}
#define STEPS16 .stage = {TURN(.15), NEWTON(.15, 2000)}
#define STEPS16_LONG .stage = {TURN(.05), NEWTON_LONG(.05, 2000)}
#define STEPS16_POLY .stage = {TURN(.15), NEWTON_POLY(.15)}
#define STEPS16_POLY_LONG .stage = {TURN(.05), NEWTON_POLY_LONG(.05)}
/* 7,721 parameters: the smaller system is that in the rows, and few of them are more steps */
#define FULL16(config) MODEL(config), .stage = {NEWTON(0, 500)}
#define LATENT16(id, where, d, trajectories, repeats, what) \
    JOINTS(LATENT, id, where, trajectories, repeats, 60, MODEL(chart16_d##d), .latent = what, STEPS16)
#define FEW16(name_, where, d, trajectories) \
    JOINTS(LAGRANGE, name_ "-few" #trajectories "-ro", where, trajectories, 1, 60, MODEL(chart16_d##d), STEPS16), \
    JOINTS(LAGRANGE, name_ "-few" #trajectories "-poly", where, trajectories, 1, 60, MODEL(chart16_d##d##_poly), STEPS16_POLY), \
    JOINTS(LAGRANGE, name_ "-few" #trajectories "-full", where, trajectories, 1, 60, FULL16(full16))
/* rivals in as many repeats as given */
#define SIXTEEN(name_, where, d, longer, repeats) \
    JOINTS(LAGRANGE, name_ "-ro", where, 200, 3, 60, MODEL(chart16_d##d), STEPS16), \
    JOINTS(LAGRANGE, name_ "-300-ro", where, 200, 3, 300, MODEL(chart16_d##longer), STEPS16_LONG), \
    JOINTS(LAGRANGE, name_ "-300-chol", where, 200, 3, 300, MODEL(chart16_d##longer##_chol), STEPS16_LONG), \
    JOINTS(LAGRANGE, name_ "-poly", where, 200, 3, 60, MODEL(chart16_d##d##_poly), STEPS16_POLY), \
    JOINTS(LAGRANGE, name_ "-300-poly", where, 200, 3, 300, MODEL(chart16_d##longer##_poly), STEPS16_POLY_LONG), \
    JOINTS(LAGRANGE, name_ "-paper", where, 200, repeats, 60, MODEL(layered16), .stage = {PAPER}), \
    JOINTS(LAGRANGE, name_ "-pod", where, 200, repeats, 60, MODEL(pod16), .stage = {NEWTON(0, 2000)}), \
    JOINTS(LAGRANGE, name_ "-full", where, 200, repeats, 60, FULL16(full16)), \
    LATENT16(name_ "-mlp", where, d, 200, repeats, LATENT_MLP), \
    LATENT16(name_ "-hnn", where, d, 200, repeats, LATENT_HNN), \
    LATENT16(name_ "-symoden", where, d, 200, repeats, LATENT_SYMODEN), \
    JOINTS(LAGRANGE, name_ "-chol", where, 200, repeats, 60, MODEL(chart16_d##d##_chol), STEPS16), \
    JOINTS(LAGRANGE, name_ "-fullchol", where, 200, repeats, 60, FULL16(full16_chol)), \
    {.name = name_ "-opinf", .kind = OPINF, .system = where, .train = 200, .seeds = 1, .n = 4}, \
    {.name = name_ "-opinfaffine", .kind = OPINF_AFFINE, .system = where, .train = 200, .seeds = 1, .n = 4}, \
    JOINTS(LAGRANGE, name_ "-300-pod", where, 200, 1, 300, MODEL(pod16), .stage = {NEWTON_LONG(0, 2000)}), \
    JOINTS(LAGRANGE, name_ "-300-podpoly", where, 200, 1, 300, MODEL(pod16_poly), .stage = {NEWTON_POLY_LONG(0)}), \
    JOINTS(LAGRANGE, name_ "-300-full", where, 200, 1, 300, MODEL(full16), .stage = {NEWTON_LONG(0, 500)}), \
    JOINTS(LAGRANGE, name_ "-300-paper", where, 200, 1, 300, MODEL(layered16), .stage = {PAPER}), \
    FEW16(name_, where, d, 5), FEW16(name_, where, d, 10), FEW16(name_, where, d, 20), FEW16(name_, where, d, 40)
/* learned from starts of .3 rad, tested from .5 */
#define NARROW(id, what) LATENT16("pend16-narrow-" id, TRUTH_PEND16_NARROW, 4, 200, 1, what)

/* ---- rope and cloth, in POD coordinates. Accelerations of the rope come from a parabola through 41 ms, across vibrations that n
   coordinates do not hold; forces of the cloth in units of 7e-5 N, so that masses are of order one. ---- */

/* Huber's loss begins at 20 means here. Many rows are windows, which are three times as large as others, and 5 means bend them
   (docs/accuracy.md, "What was tried"). */
enum { MILD = 20 };

#define GRID(id, where, trajectories, unit, repeats, time, ...) \
    {.name = id, .kind = LAGRANGE, .system = where, .train = trajectories, .force = unit, .seeds = repeats, .seconds = time, \
     __VA_ARGS__}
#define GRID_OPINF(id, where, trajectories, unit) \
    {.name = id "-opinf", .kind = OPINF, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-opinfaffine", .kind = OPINF_AFFINE, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-fit", .kind = FIT, .system = where, .train = trajectories, .seeds = 1}
#define SMOOTH(p, rows) {.kind = STAGE_NEWTON, .part = p, .batch = rows, .smooth = 20, .cap = MILD}
#define LAYERED_GRID(id, where, trajectories, unit, ...) \
    {.name = id, .kind = LAGRANGE, .system = where, .train = trajectories, .force = unit, .seeds = 1, .seconds = 300, \
     __VA_ARGS__}
#define GRID_ODE(p, size, H, samples, ae, net, pos, vel) \
    {.kind = STAGE_ODE, .part = p, .batch = size, .steps = H, .stride = samples, .lr_ae = ae, .lr_net = net, .fall = 1e-3, \
     .w_q = pos, .w_pos = 10, .w_qd = vel, .bias = .01}
#define GRID_AE(p) {.kind = STAGE_AE, .part = p, .batch = 64, .lr_ae = .3, .fall = 1e-3, .w_q = 50, .w_qd = 1, .bias = .01}
/* accelerations before windows: from random networks roll-outs run away */
#define GRID_ACC(pos, vel) \
    {.kind = STAGE_ACC, .part = .2, .batch = 64, .lr_ae = .02, .lr_net = 3e-3, .fall = 1e-3, .w_q = pos, .w_acc = .003, \
     .w_qd = vel, .bias = .01, .smooth = 10}
#define ROPE_PAPER \
    .stage = {GRID_AE(.25), GRID_ACC(200, .1), GRID_ODE(.25, 32, 8, 10, .01, 2e-3, 200, .1), \
              GRID_ODE(.3, 32, 25, 10, .005, 1e-3, 200, .1)}
#define CLOTH_PAPER \
    .stage = {GRID_AE(.25), GRID_ACC(50, .3), GRID_ODE(.25, 32, 8, 5, .01, 2e-3, 50, .3), \
              GRID_ODE(.3, 32, 25, 5, .005, 1e-3, 50, .3)}
#define ROPE_STEPS \
    .stage = {TURN(.05), SMOOTH(.15, 1000), WINDOWS(.2, 1000, .3, 8, 20, .smooth = 10, .cap = MILD), \
              WINDOWS(.6, 1000, .3, 25, 20, .smooth = 10, .last = 2, .cap = MILD)}
#define ROPE(id, repeats, time, config) GRID("rope-" id, TRUTH_ROPE, 100, 0, repeats, time, POD(64, config), ROPE_STEPS)
#define CLOTH_STEPS \
    .stage = {TURN(.05), WINDOWS(.2, 1000, .8, 2, 5, .cap = MILD), WINDOWS(.25, 1000, .8, 8, 5, .cap = MILD), \
              WINDOWS(.5, 1000, .5, 25, 5, .last = 2, .cap = MILD)}
#define CLOTH(id, unit, repeats, time, config) \
    GRID("cloth-" id, TRUTH_CLOTH, 60, unit, repeats, time, POD(128, config), CLOTH_STEPS)

/* ---- charts alone: E_q at 0 ms and seconds; the encoder turns until that gains no more ---- */

#define ALONE(id, where, trajectories, model_, ...) \
    {.name = "chart-" id, .kind = CHART, .system = where, .train = trajectories, .seeds = 1, .seconds = 60, model_, __VA_ARGS__}
#define BENT(id, where, trajectories, model_) ALONE(id, where, trajectories, model_, .stage = {TURN(1)})
#define CHARTS16(id, where) \
    BENT(id "-pod", where, 200, MODEL(pod16)), BENT(id "-d2", where, 200, MODEL(chart16_d2)), \
    BENT(id "-d3", where, 200, MODEL(chart16_d3)), BENT(id "-d4", where, 200, MODEL(chart16_d4)), \
    BENT(id "-d5", where, 200, MODEL(chart16_d5)), BENT(id "-d6", where, 200, MODEL(chart16_d6)), \
    BENT(id "-d8", where, 200, MODEL(chart16_d8)), \
    ALONE(id "-layered", where, 200, MODEL(layered16), .stage = {ADAM(STAGE_AE, 1, .1, 0, .w_q = 2)})
#define BENT_ROPE(id, config) BENT("rope-" id, TRUTH_ROPE, 100, POD(64, config))
#define BENT_CLOTH(id, config) BENT("cloth-" id, TRUTH_CLOTH, 60, POD(128, config))

const struct recipe recipes[] = {
    PEND2("exp", pend2),
    PEND2("base", pend2_base),
    PEND2("gyro", pend2_gyro),
    PEND2("basegyro", pend2_base_gyro),
    PEND2("chol", pend2_chol),
    PEND2("angles", pend2_angles),
    PEND2("poly", pend2_poly),
    PEND2_LATENT("mlp", 40, LATENT_MLP),
    PEND2_LATENT("hnn", 40, LATENT_HNN),
    PEND2_LATENT("symoden", 40, LATENT_SYMODEN),
    PEND2_FEW(5),
    PEND2_FEW(10),
    PEND2_FEW(20),
    TURNING("exp", pend2),
    TURNING("angles", pend2_angles),
    TURNING("poly", pend2_poly),

    SIXTEEN("pend16", TRUTH_PEND16, 4, 4, 3),
    LATENT16("pend16-dhnn", TRUTH_PEND16, 4, 200, 1, LATENT_DHNN),
    LATENT16("pend16-comet", TRUTH_PEND16, 4, 200, 1, LATENT_COMET),
    JOINTS(LAGRANGE, "pend16-1200-ro", TRUTH_PEND16, 200, 1, 1200, MODEL(chart16_d4), STEPS16_LONG),
    JOINTS(LAGRANGE, "pend16-1200-chol", TRUTH_PEND16, 200, 1, 1200, MODEL(chart16_d4_chol), STEPS16_LONG),
    {.name = "pend16-pd", .kind = LAGRANGE, .system = TRUTH_PEND16_PD, .train = 200, .force = 1, .seeds = 3, .seconds = 60,
     MODEL(chart16_d4), STEPS16},
    JOINTS(LAGRANGE, "pend16-narrow-ro", TRUTH_PEND16_NARROW, 200, 1, 60, MODEL(chart16_d4), STEPS16),
    NARROW("mlp", LATENT_MLP),
    NARROW("hnn", LATENT_HNN),
    NARROW("symoden", LATENT_SYMODEN),
    SIXTEEN("wave16", TRUTH_WAVE16, 6, 8, 1),

    OPTIMISERS("pend2", TRUTH_PEND2_ACT, 40, 1, 30, MODEL(pend2)),
    OPTIMISERS("pend16", TRUTH_PEND16, 200, 0, 30, MODEL(chart16_d4)),

    GRID_OPINF("rope", TRUTH_ROPE, 100, 0),
    ROPE("n4", 1, 60, rope_n4_d5),
    ROPE("n6", 1, 60, rope_n6),
    ROPE("n10", 3, 300, rope_n10_d3),
    ROPE("poly", 1, 300, rope_n10_poly),
    ROPE("n14", 1, 60, rope_n14),
    ROPE("pod", 1, 60, rope_n10_pod),
    GRID_OPINF("cloth", TRUTH_CLOTH, 60, 7e-5),
    CLOTH("n4", 7e-5, 1, 60, cloth_n4),
    CLOTH("n6", 7e-5, 1, 60, cloth_n6),
    CLOTH("n10", 7e-5, 3, 300, cloth_n10_d3),
    CLOTH("n14", 7e-5, 1, 60, cloth_n14),
    CLOTH("free-n10", 0, 1, 300, cloth_free_n10),
    CLOTH("pod", 7e-5, 1, 60, cloth_n10_pod),
    LAYERED_GRID("rope-paper", TRUTH_ROPE, 100, 0, POD(48, rope_layers), .zoom = 6.7, ROPE_PAPER),
    LAYERED_GRID("cloth-paper", TRUTH_CLOTH, 60, 7e-5, POD(48, cloth_layers), .zoom = 3.3, CLOTH_PAPER),
    LAYERED_GRID("cloth-free-paper", TRUTH_CLOTH, 60, 0, POD(48, cloth_free_layers), .zoom = 3.3, CLOTH_PAPER),

    CHARTS16("pend16", TRUTH_PEND16),
    CHARTS16("wave16", TRUTH_WAVE16),
    BENT_ROPE("n4-pod", rope_n4_pod),
    BENT_ROPE("n4-d2", rope_n4_d2),
    BENT_ROPE("n4-d3", rope_n4_d3),
    BENT_ROPE("n4-d4", rope_n4_d4),
    BENT_ROPE("n4-d5", rope_n4_d5),
    ALONE("rope-n4-layered", TRUTH_ROPE, 100, POD(48, rope_n4_layers), .zoom = 6.7, .stage = {GRID_AE(1)}),
    BENT_ROPE("n10-pod", rope_n10_pod),
    BENT_ROPE("n10-d2", rope_n10_d2),
    BENT_ROPE("n10-d3", rope_n10_d3),
    BENT_ROPE("n10-d4", rope_n10_d4),
    ALONE("rope-n10-layered", TRUTH_ROPE, 100, POD(48, rope_layers), .zoom = 6.7, .stage = {GRID_AE(1)}),
    BENT_CLOTH("n10-pod", cloth_n10_pod),
    BENT_CLOTH("n10-d2", cloth_n10_d2),
    BENT_CLOTH("n10-d3", cloth_n10_d3),
    BENT_CLOTH("n10-d4", cloth_n10_d4),
    ALONE("cloth-n10-layered", TRUTH_CLOTH, 60, POD(48, cloth_layers), .zoom = 3.3, .stage = {GRID_AE(1)}),
};
const int recipes_count = sizeof recipes / sizeof *recipes;

const struct recipe *recipe_of(const char *name)
{
    for (int i = 0; i < recipes_count; i++)
        if (strcmp(name, recipes[i].name) == 0) return &recipes[i];
    return NULL;
}

const struct recipe *recipe_of_run(const char *run, int *seed)
{
    const char *dash = strrchr(run, '-');
    char name[64];
    if (!dash || dash - run >= (long)sizeof name) return NULL;
    memcpy(name, run, (size_t)(dash - run));
    name[dash - run] = 0;
    *seed = atoi(dash + 1);
    const struct recipe *e = recipe_of(name);
    return e && *seed >= 1 && *seed <= e->seeds ? e : NULL;
}

const struct config *recipe_weights(const struct recipe *e)
{
    return e->pod > 0 ? e->whole : e->model;
}

void recipes_list(void)
{
    static const char *const system[TRUTH_SYSTEMS] = {
        [TRUTH_PEND2_ACT] = "pend2, torques", [TRUTH_PEND16_PD] = "pend16, PD torques",
        [TRUTH_PEND16_NARROW] = "pend16, starts of .3 rad",
    };
    for (int i = 0; i < recipes_count; i++)
        for (int s = 1; s <= recipes[i].seeds; s++) {
            const enum truth_system w = recipes[i].system;
            printf("%s-%d %d %s", recipes[i].name, s, recipes[i].train, system[w] ? system[w] : truth_name(w));
            if (recipes[i].recorded > 0) printf(", simulated with seed %d", recipes[i].recorded);
            printf("\n");
        }
}

void recipes_configs(void)
{
    for (int i = 0; i < recipes_count; i++)
        for (int s = 1; s <= recipes[i].seeds; s++)
            printf("%s-%d %s\n", recipes[i].name, s, recipes[i].config ? recipes[i].config : "-");
}
