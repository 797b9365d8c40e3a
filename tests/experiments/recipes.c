/* SPDX-License-Identifier: MIT */
/* recipes.c - the run list. */
#include <stdlib.h>
#include <string.h>

#include "recipes.h"

/* ---- shapes: no autoencoder; a chart of 16 joints; POD; the layered autoencoder of the paper ---- */

#define FULL(n, ...) .shape = {.ae = {n}, .mlp = 32, .slope = 1, .zoom = 1, __VA_ARGS__}
#define CHART16(d, ...) .shape = {.ae = {16, 4}, .degree = d, .mlp = 32, .slope = 1, .zoom = 1, __VA_ARGS__}
#define POD16 .shape = {.ae = {16, 4}, .mlp = 32, .slope = 1, .zoom = 1}
#define LAYERED16 .shape = {.ae = {16, 16, 16, 16, 12, 8, 4}, .mlp = 64, .slope = .6, .zoom = 1}

/* ---- stages: they share the seconds of a run ---- */

#define TURN(p) {.kind = STAGE_CHART, .part = p, .batch = 4000}
#define SINGLE(p, rows) {.kind = STAGE_NEWTON, .part = p, .batch = rows}
#define WINDOWS(p, rows, part_, H, samples, ...) \
    {.kind = STAGE_NEWTON, .part = p, .batch = rows, .share = part_, .steps = H, .stride = samples, __VA_ARGS__}
/* rows of single samples, then windows of half a second among them */
#define NEWTON(first, rows) SINGLE(.35 - first, rows), WINDOWS(.65, rows, .05, 25, 20, .last = 2)
/* 16 joints for 300 s and more: with a memory of 8 steps single samples lead astray after hundreds of them, and windows come to no
   rest */
#define NEWTON_LONG(first, rows) \
    {.kind = STAGE_NEWTON, .part = .15 - first, .batch = rows, .memory = 4}, \
        WINDOWS(.85, rows, .05, 25, 20, .memory = 4, .last = 1)
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
#define PEND2(id, ...) PEND2_AS(LAGRANGE, id, 40, 3, FULL(2, __VA_ARGS__), .stage = {NEWTON(0, 2000)})
#define PEND2_LATENT(id, trajectories, what) \
    PEND2_AS(LATENT, id, trajectories, 3, FULL(2, .base = 0), .latent = what, .stage = {NEWTON(0, 2000)})
#define PEND2_FEW(trajectories) \
    PEND2_AS(LAGRANGE, "few" #trajectories "-exp", trajectories, 3, FULL(2, .base = 0), .stage = {NEWTON(0, 2000)}), \
    PEND2_AS(LAGRANGE, "few" #trajectories "-chol", trajectories, 3, FULL(2, .mass = ROLN_CHOLESKY), .stage = {NEWTON(0, 2000)}), \
    PEND2_LATENT("few" #trajectories "-mlp", trajectories, LATENT_MLP)
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
/* 7,721 parameters: the smaller system is that in the rows, and few of them are more steps */
#define FULL16(...) FULL(16, __VA_ARGS__), .stage = {NEWTON(0, 500)}
#define LATENT16(id, where, d, trajectories, repeats, what) \
    JOINTS(LATENT, id, where, trajectories, repeats, 60, CHART16(d, .base = 0), .latent = what, STEPS16)
#define FEW16(name_, where, d, trajectories) \
    JOINTS(LAGRANGE, name_ "-few" #trajectories "-ro", where, trajectories, 1, 60, CHART16(d, .base = 0), STEPS16), \
    JOINTS(LAGRANGE, name_ "-few" #trajectories "-full", where, trajectories, 1, 60, FULL16(.base = 0))
/* rivals in as many repeats as given */
#define SIXTEEN(name_, where, d, longer, repeats) \
    JOINTS(LAGRANGE, name_ "-ro", where, 200, 3, 60, CHART16(d, .base = 0), STEPS16), \
    JOINTS(LAGRANGE, name_ "-300-ro", where, 200, 3, 300, CHART16(longer, .base = 0), STEPS16_LONG), \
    JOINTS(LAGRANGE, name_ "-300-chol", where, 200, 3, 300, CHART16(longer, .mass = ROLN_CHOLESKY), STEPS16_LONG), \
    JOINTS(LAGRANGE, name_ "-paper", where, 200, repeats, 60, LAYERED16, .stage = {PAPER}), \
    JOINTS(LAGRANGE, name_ "-pod", where, 200, repeats, 60, POD16, .stage = {NEWTON(0, 2000)}), \
    JOINTS(LAGRANGE, name_ "-full", where, 200, repeats, 60, FULL16(.base = 0)), \
    LATENT16(name_ "-mlp", where, d, 200, repeats, LATENT_MLP), \
    LATENT16(name_ "-hnn", where, d, 200, repeats, LATENT_HNN), \
    LATENT16(name_ "-symoden", where, d, 200, repeats, LATENT_SYMODEN), \
    JOINTS(LAGRANGE, name_ "-chol", where, 200, repeats, 60, CHART16(d, .mass = ROLN_CHOLESKY), STEPS16), \
    JOINTS(LAGRANGE, name_ "-fullchol", where, 200, repeats, 60, FULL16(.mass = ROLN_CHOLESKY)), \
    {.name = name_ "-opinf", .kind = OPINF, .system = where, .train = 200, .seeds = 1, .n = 4}, \
    {.name = name_ "-opinfaffine", .kind = OPINF_AFFINE, .system = where, .train = 200, .seeds = 1, .n = 4}, \
    JOINTS(LAGRANGE, name_ "-300-pod", where, 200, 1, 300, POD16, .stage = {NEWTON_LONG(0, 2000)}), \
    JOINTS(LAGRANGE, name_ "-300-full", where, 200, 1, 300, FULL(16, .base = 0), .stage = {NEWTON_LONG(0, 500)}), \
    JOINTS(LAGRANGE, name_ "-300-paper", where, 200, 1, 300, LAYERED16, .stage = {PAPER}), \
    FEW16(name_, where, d, 5), FEW16(name_, where, d, 10), FEW16(name_, where, d, 20), FEW16(name_, where, d, 40)
/* learned from starts of .3 rad, tested from .5 */
#define NARROW(id, what) LATENT16("pend16-narrow-" id, TRUTH_PEND16_NARROW, 4, 200, 1, what)

/* ---- rope and cloth, in POD coordinates. Accelerations of the rope come from a parabola through 41 ms, across vibrations that n
   coordinates do not hold; forces of the cloth in units of 7e-5 N, so that masses are of order one. ---- */

#define GRID(id, where, trajectories, unit, repeats, time, r, ...) \
    {.name = id, .kind = LAGRANGE, .system = where, .train = trajectories, .force = unit, .seeds = repeats, .seconds = time, \
     .pod = r, __VA_ARGS__}
#define GRID_OPINF(id, where, trajectories, unit) \
    {.name = id "-opinf", .kind = OPINF, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-opinfaffine", .kind = OPINF_AFFINE, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-fit", .kind = FIT, .system = where, .train = trajectories, .seeds = 1}
#define GRID_SHAPE(r, n, d, ...) .shape = {.ae = {r, n}, .degree = d, .mlp = 20, .slope = 1, .zoom = 1, __VA_ARGS__}
#define SMOOTH(p, rows) {.kind = STAGE_NEWTON, .part = p, .batch = rows, .smooth = 20}
#define GRID_LAYERED(n, ...) \
    .shape = {.ae = {48, 48, 48, 48, 48, 48, 48, 48, n}, .mlp = 64, .slope = .6, .zoom = 6.7, __VA_ARGS__}
#define CLOTH_LAYERED(...) \
    .shape = {.ae = {48, 48, 48, 48, 48, 32, 10}, .mlp = 64, .slope = .6, .zoom = 3.3, __VA_ARGS__}
#define LAYERED_GRID(id, where, trajectories, unit, ...) \
    {.name = id, .kind = LAGRANGE, .system = where, .train = trajectories, .force = unit, .seeds = 1, .seconds = 300, .pod = 48, \
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
    .stage = {TURN(.05), SMOOTH(.15, 1000), WINDOWS(.2, 1000, .3, 8, 20, .smooth = 10), \
              WINDOWS(.6, 1000, .3, 25, 20, .smooth = 10, .last = 2)}
#define ROPE(id, repeats, time, n, d) \
    GRID("rope-" id, TRUTH_ROPE, 100, 0, repeats, time, 64, GRID_SHAPE(64, n, d, .base = 0), ROPE_STEPS)
#define CLOTH_STEPS \
    .stage = {TURN(.05), WINDOWS(.2, 1000, .8, 2, 5, .smooth = 0), WINDOWS(.25, 1000, .8, 8, 5, .smooth = 0), \
              WINDOWS(.5, 1000, .5, 25, 5, .last = 2)}
#define CLOTH(id, unit, damped, repeats, time, n, d) \
    GRID("cloth-" id, TRUTH_CLOTH, 60, unit, repeats, time, 128, GRID_SHAPE(128, n, d, .damping = damped), CLOTH_STEPS)

/* ---- charts alone: E_q at 0 ms and seconds; the encoder turns until that gains no more ---- */

#define ALONE(id, where, trajectories, r, time, ...) \
    {.name = "chart-" id, .kind = CHART, .system = where, .train = trajectories, .seeds = 1, .seconds = time, .pod = r, __VA_ARGS__}
#define BENT(id, where, trajectories, r, N, n, d) \
    ALONE(id "-d" #d, where, trajectories, r, 60, .shape = {.ae = {N, n}, .degree = d, .mlp = 4, .slope = 1, .zoom = 1}, \
          .stage = {TURN(1)})
#define CHARTS(id, where, trajectories, r, N, n) \
    ALONE(id "-pod", where, trajectories, r, 60, .shape = {.ae = {N, n}, .mlp = 4, .slope = 1, .zoom = 1}), \
    BENT(id, where, trajectories, r, N, n, 2), BENT(id, where, trajectories, r, N, n, 3)
#define CHARTS_DEEP(id, where, trajectories, r, N, n) \
    BENT(id, where, trajectories, r, N, n, 4), BENT(id, where, trajectories, r, N, n, 5)
#define CHARTS16(id, where) \
    CHARTS(id, where, 200, 0, 16, 4), CHARTS_DEEP(id, where, 200, 0, 16, 4), BENT(id, where, 200, 0, 16, 4, 6), \
    BENT(id, where, 200, 0, 16, 4, 8), \
    ALONE(id "-layered", where, 200, 0, 60, LAYERED16, .stage = {ADAM(STAGE_AE, 1, .1, 0, .w_q = 2)})

const struct recipe recipes[] = {
    PEND2("exp", .base = 0),
    PEND2("base", .base = 1),
    PEND2("gyro", .layers = 1),
    PEND2("basegyro", .base = 1, .layers = 1),
    PEND2("chol", .mass = ROLN_CHOLESKY),
    PEND2_LATENT("mlp", 40, LATENT_MLP),
    PEND2_LATENT("hnn", 40, LATENT_HNN),
    PEND2_LATENT("symoden", 40, LATENT_SYMODEN),
    PEND2_FEW(5),
    PEND2_FEW(10),
    PEND2_FEW(20),

    SIXTEEN("pend16", TRUTH_PEND16, 4, 4, 3),
    LATENT16("pend16-dhnn", TRUTH_PEND16, 4, 200, 1, LATENT_DHNN),
    LATENT16("pend16-comet", TRUTH_PEND16, 4, 200, 1, LATENT_COMET),
    JOINTS(LAGRANGE, "pend16-1200-ro", TRUTH_PEND16, 200, 1, 1200, CHART16(4, .base = 0), STEPS16_LONG),
    JOINTS(LAGRANGE, "pend16-1200-chol", TRUTH_PEND16, 200, 1, 1200, CHART16(4, .mass = ROLN_CHOLESKY), STEPS16_LONG),
    {.name = "pend16-pd", .kind = LAGRANGE, .system = TRUTH_PEND16_PD, .train = 200, .force = 1, .seeds = 3, .seconds = 60,
     CHART16(4, .base = 0), STEPS16},
    JOINTS(LAGRANGE, "pend16-narrow-ro", TRUTH_PEND16_NARROW, 200, 1, 60, CHART16(4, .base = 0), STEPS16),
    NARROW("mlp", LATENT_MLP),
    NARROW("hnn", LATENT_HNN),
    NARROW("symoden", LATENT_SYMODEN),
    SIXTEEN("wave16", TRUTH_WAVE16, 6, 8, 1),

    OPTIMISERS("pend2", TRUTH_PEND2_ACT, 40, 1, 30, FULL(2, .base = 0)),
    OPTIMISERS("pend16", TRUTH_PEND16, 200, 0, 30, CHART16(4, .base = 0)),

    GRID_OPINF("rope", TRUTH_ROPE, 100, 0),
    ROPE("n4", 1, 60, 4, 5),
    ROPE("n6", 1, 60, 6, 4),
    ROPE("n10", 3, 300, 10, 3),
    ROPE("n14", 1, 60, 14, 3),
    GRID("rope-pod", TRUTH_ROPE, 100, 0, 1, 60, 64, GRID_SHAPE(64, 10, 0, .base = 0), ROPE_STEPS),
    GRID_OPINF("cloth", TRUTH_CLOTH, 60, 7e-5),
    CLOTH("n4", 7e-5, 0, 1, 60, 4, 5),
    CLOTH("n6", 7e-5, 0, 1, 60, 6, 4),
    CLOTH("n10", 7e-5, 0, 3, 300, 10, 3),
    CLOTH("n14", 7e-5, 0, 1, 60, 14, 3),
    CLOTH("free-n10", 0, 1, 1, 300, 10, 3),
    GRID("cloth-pod", TRUTH_CLOTH, 60, 7e-5, 1, 60, 128, GRID_SHAPE(128, 10, 0, .base = 0), CLOTH_STEPS),
    LAYERED_GRID("rope-paper", TRUTH_ROPE, 100, 0, GRID_LAYERED(10, .base = 0), ROPE_PAPER),
    LAYERED_GRID("cloth-paper", TRUTH_CLOTH, 60, 7e-5, CLOTH_LAYERED(.damping = 0), CLOTH_PAPER),
    LAYERED_GRID("cloth-free-paper", TRUTH_CLOTH, 60, 0, CLOTH_LAYERED(.damping = 1), CLOTH_PAPER),

    CHARTS16("pend16", TRUTH_PEND16),
    CHARTS16("wave16", TRUTH_WAVE16),
    CHARTS("rope-n4", TRUTH_ROPE, 100, 64, 64, 4),
    CHARTS_DEEP("rope-n4", TRUTH_ROPE, 100, 64, 64, 4),
    ALONE("rope-n4-layered", TRUTH_ROPE, 100, 48, 60, GRID_LAYERED(4, .base = 0), .stage = {GRID_AE(1)}),
    CHARTS("rope-n10", TRUTH_ROPE, 100, 64, 64, 10),
    BENT("rope-n10", TRUTH_ROPE, 100, 64, 64, 10, 4),
    ALONE("rope-n10-layered", TRUTH_ROPE, 100, 48, 60, GRID_LAYERED(10, .base = 0), .stage = {GRID_AE(1)}),
    CHARTS("cloth-n10", TRUTH_CLOTH, 60, 128, 128, 10),
    BENT("cloth-n10", TRUTH_CLOTH, 60, 128, 128, 10, 4),
    ALONE("cloth-n10-layered", TRUTH_CLOTH, 60, 48, 60, CLOTH_LAYERED(.damping = 0), .stage = {GRID_AE(1)}),
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

struct shape recipe_shape(const struct recipe *e)
{
    return e->pod > 0 ? model_full_shape(&e->shape, truth_dof(e->system)) : e->shape;
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
            printf("%s-%d %d %s\n", recipes[i].name, s, recipes[i].train, system[w] ? system[w] : truth_name(w));
        }
}
