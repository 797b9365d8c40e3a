/* recipes.c - the run list. */
#include <stdlib.h>
#include <string.h>

#include "recipes.h"

/* ---- shapes: n = 2 and n = 16 without, and 16 joints with autoencoder ---- */

#define FULL(n, ...) .shape = {.ae = {n}, .mlp = 64, .slope = .6, .zoom = 1, __VA_ARGS__}
#define REDUCED(width, ...) .shape = {.ae = {16, 16, 16, 16, 12, 8, 4}, .mlp = width, .slope = .6, .zoom = 1, __VA_ARGS__}
#define LONG16 .shape = {.ae = {16, 16, 16, 16, 16, 12, 8, 4}, .mlp = 96, .slope = .6, .zoom = 1}
#define POD16 .shape = {.ae = {16, 4}, .mlp = 64, .slope = 1, .zoom = 1}

/* ---- stages: the autoencoder alone; the acceleration loss; the ODE loss over windows of H steps of `ms` samples ---- */

#define AE(n, size) {.kind = STAGE_AE, .updates = n, .batch = size, .lr_ae = .1, .fall = 1e-3, .w_q = 2, .w_qd = 1, .bias = 1}
#define ACC(n, ae, net) \
    {.kind = STAGE_ACC, .updates = n, .batch = 64, .lr_ae = ae, .lr_net = net, .fall = 1e-3, .w_q = 2, .w_acc = .1, .w_qd = 1, \
     .bias = 1}
#define ACC_FULL(n, net) {.kind = STAGE_ACC, .updates = n, .batch = 64, .lr_net = net, .fall = 1e-3, .w_acc = 1, .w_qd = 1}
#define ODE(n, size, H, ms, ae, net, pos) \
    {.kind = STAGE_ODE, .updates = n, .batch = size, .steps = H, .stride = ms, .lr_ae = ae, .lr_net = net, .fall = 1e-3, .w_q = 2, \
     .w_pos = pos, .w_qd = 1, .bias = 1}
#define LONG_ODE(n, H, ms, ae, net) \
    {.kind = STAGE_ODE, .updates = n, .batch = 32, .steps = H, .stride = ms, .lr_ae = ae, .lr_net = net, .fall = 1e-3, .w_q = 20, \
     .w_pos = 1, .w_qd = 1, .bias = 1}

/* ---- pend2: 2.56 million samples; an update of the ODE loss costs batch (H + 1) ---- */

#define PEND2(id, trajectories, ...) \
    {.name = "pend2-" id, .kind = LAGRANGE, .system = TRUTH_PEND2_ACT, .train = trajectories, .force = 1, .seeds = 5, __VA_ARGS__}
#define PEND2_BOTH(id, ...) \
    PEND2(id "-acc", 40, FULL(2, __VA_ARGS__), .stage = {ACC_FULL(40000, 5e-3)}), \
    PEND2(id "-ode", 40, FULL(2, __VA_ARGS__), .stage = {ACC_FULL(30000, 5e-3), ODE(1111, 64, 8, 5, 0, 1.5e-3, 0)})
#define PEND2_FEW(trajectories) \
    PEND2("few" #trajectories "-exp", trajectories, FULL(2, .base = 0), .stage = {ACC_FULL(40000, 5e-3)}), \
    PEND2("few" #trajectories "-chol", trajectories, FULL(2, .mass = ROLN_CHOLESKY), .stage = {ACC_FULL(40000, 5e-3)}), \
    {.name = "pend2-few" #trajectories "-mlp", .kind = LATENT, .system = TRUTH_PEND2_ACT, .train = trajectories, .force = 1, \
     .seeds = 5, .parent = "pend2-few" #trajectories "-exp", .latent = LATENT_MLP, .stage = {ACC_FULL(40000, 5e-3)}}

/* ---- pend16: 20 million samples; with few trajectories 4, with a narrow range 7; no force does work ---- */

#define PEND16(id, trajectories, repeats, ...) \
    {.name = "pend16-" id, .kind = LAGRANGE, .system = TRUTH_PEND16, .train = trajectories, .seeds = repeats, __VA_ARGS__}
#define PEND16_LATENT(id, where, trajectories, repeats, n, from, what) \
    {.name = "pend16-" id, .kind = LATENT, .system = where, .train = trajectories, .seeds = repeats, .parent = "pend16-" from, \
     .latent = what, .stage = {ACC_FULL(n, 3e-3)}}
#define PEND16_FEW(trajectories) \
    PEND16("few" #trajectories "-ro", trajectories, 1, REDUCED(64, .base = 0), .stage = {AE(10000, 128), ACC(40000, .1, 3e-3)}), \
    PEND16("few" #trajectories "-full", trajectories, 1, FULL(16, .base = 0), .stage = {ACC_FULL(60000, 3e-3)}), \
    PEND16_LATENT("few" #trajectories "-mlp", TRUTH_PEND16, trajectories, 1, 40000, "few" #trajectories "-ro", LATENT_MLP)
#define PEND16_OPINF(id, what) {.name = "pend16-" id, .kind = what, .system = TRUTH_PEND16, .train = 200, .seeds = 1, .n = 4}
#define SAME(id, what) PEND16_LATENT(id, TRUTH_PEND16, 200, 5, 270000, "acc", what)
/* learned from starts of .3 rad, tested from .5 */
#define NARROW(id, what) PEND16_LATENT("narrow-" id, TRUTH_PEND16_NARROW, 200, 2, 90000, "narrow-ro", what)

/* ---- rope and cloth, in POD coordinates. Positions count more than velocities, of which vibrations that n coordinates do not
   hold are a twentieth and more; accelerations of the rope come from a parabola through 21 ms, across these vibrations. The
   windows of the ODE loss grow until they are as long as a trajectory. ---- */

#define GRID_AE(n) {.kind = STAGE_AE, .updates = n, .batch = 64, .lr_ae = .3, .fall = 1e-3, .w_q = 50, .w_qd = 1, .bias = .01}
#define GRID_ACC(n, pos) \
    {.kind = STAGE_ACC, .updates = n, .batch = 64, .lr_ae = .02, .lr_net = 3e-3, .fall = 1e-3, .w_q = pos, .w_acc = .003, \
     .w_qd = .1, .bias = .01, .smooth = 10}
#define GRID_ODE(n, size, H, ms, ae, net, pos, vel) \
    {.kind = STAGE_ODE, .updates = n, .batch = size, .steps = H, .stride = ms, .lr_ae = ae, .lr_net = net, .fall = 1e-3, \
     .w_q = pos, .w_pos = 10, .w_qd = vel, .bias = .01}
#define GRID_OPINF(id, where, trajectories, unit) \
    {.name = id "-opinf", .kind = OPINF, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-opinfaffine", .kind = OPINF_AFFINE, .system = where, .train = trajectories, .force = unit, .seeds = 1, .n = 10}, \
    {.name = id "-fit", .kind = FIT, .system = where, .train = trajectories, .seeds = 1}
#define ROPE(id, repeats, n, updates, ...) \
    {.name = "rope-" id, .kind = LAGRANGE, .system = TRUTH_ROPE, .train = 100, .seeds = repeats, .pod = 48, \
     .shape = {.ae = {48, 48, 48, 48, 48, 48, 48, 48, n}, .mlp = 64, .slope = .6, .zoom = 6.7}, \
     .stage = {GRID_AE(updates), __VA_ARGS__}}
#define ROPE_SHORT GRID_ACC(40000, 200), GRID_ODE(2000, 32, 8, 10, .01, 2e-3, 200, .1)
#define ROPE_LONG \
    GRID_ACC(120000, 200), GRID_ODE(4000, 32, 8, 10, .01, 2e-3, 200, .1), GRID_ODE(2000, 32, 20, 10, .005, 1e-3, 200, .1), \
    GRID_ODE(3000, 32, 25, 20, .005, 1e-3, 200, .1), GRID_ODE(2000, 16, 49, 20, .003, 1e-3, 200, .1)
/* forces in units of 7e-5 N, so that masses are of order one */
#define CLOTH(id, unit, damped, n, ...) \
    {.name = "cloth-" id, .kind = LAGRANGE, .system = TRUTH_CLOTH, .train = 60, .force = unit, .seeds = 1, .pod = 48, \
     .shape = {.ae = {48, 48, 48, 48, 48, 32, n}, .mlp = 64, .damping = damped, .slope = .6, .zoom = 3.3}, \
     .stage = {GRID_AE(60000), __VA_ARGS__}}
#define CLOTH_SHORT GRID_ODE(8000, 64, 2, 5, .005, 3e-3, 50, .3), GRID_ODE(6000, 32, 8, 5, .01, 2e-3, 50, .3)
#define CLOTH_LONG CLOTH_SHORT, GRID_ODE(3000, 32, 25, 5, .005, 1e-3, 50, .3), GRID_ODE(3000, 16, 49, 5, .003, 1e-3, 50, .3)

const struct recipe recipes[] = {
    PEND2_BOTH("exp", .base = 0),
    PEND2_BOTH("base", .base = 1),
    PEND2_BOTH("gyro", .layer = {ROLN_GYRO}),
    PEND2_BOTH("basegyro", .base = 1, .layer = {ROLN_GYRO}),
    PEND2_BOTH("chol", .mass = ROLN_CHOLESKY),
    PEND2_FEW(5),
    PEND2_FEW(10),
    PEND2_FEW(20),
    PEND2_FEW(40),

    PEND16("acc", 200, 5, REDUCED(64, .base = 0), .stage = {AE(20000, 128), ACC(270000, .1, 3e-3)}),
    PEND16("ode", 200, 5, REDUCED(64, .base = 0),
           .stage = {AE(20000, 128), ACC(180000, .1, 3e-3), ODE(10000, 64, 8, 5, .03, 1e-3, 0)}),
    PEND16("chol", 200, 5, REDUCED(64, .mass = ROLN_CHOLESKY), .stage = {AE(20000, 128), ACC(270000, .1, 3e-3)}),
    PEND16("seq", 200, 5, REDUCED(64, .base = 0), .stage = {AE(75000, 128), ACC(160000, 0, 3e-3)}),
    PEND16("frozen", 200, 1, REDUCED(64, .base = 0), .parent = "pend16-acc", .fresh = 1, .stage = {ACC(270000, 0, 3e-3)}),
    PEND16("pod", 200, 5, POD16, .stage = {ACC(310000, 0, 3e-3)}),
    PEND16("full", 200, 2, FULL(16, .base = 0), .stage = {ACC_FULL(310000, 3e-3)}),
    PEND16("fullchol", 200, 1, FULL(16, .mass = ROLN_CHOLESKY), .stage = {ACC_FULL(310000, 3e-3)}),
    PEND16_OPINF("opinf", OPINF),
    PEND16_OPINF("opinfaffine", OPINF_AFFINE),
    SAME("mlp", LATENT_MLP),
    SAME("hnn", LATENT_HNN),
    SAME("dhnn", LATENT_DHNN),
    SAME("symoden", LATENT_SYMODEN),
    SAME("comet", LATENT_COMET),
    PEND16("longacc", 1000, 1, LONG16, .stage = {AE(20000, 128), ACC(400000, .1, 3e-3), ACC(300000, .04, 2.5e-3)}),
    PEND16("long", 1000, 1, LONG16, .parent = "pend16-longacc",
           .stage = {LONG_ODE(8000, 25, 10, .01, 1e-3), LONG_ODE(6000, 50, 20, .005, 5e-4), LONG_ODE(2500, 100, 20, .003, 3e-4),
                    LONG_ODE(1500, 149, 20, .003, 3e-4)}),
    {.name = "pend16-pd", .kind = LAGRANGE, .system = TRUTH_PEND16_PD, .train = 200, .force = 1, .seeds = 3, REDUCED(64, .base = 0),
     .stage = {AE(20000, 128), {.kind = STAGE_ACC, .updates = 270000, .batch = 64, .lr_ae = .05, .lr_net = 3e-3, .fall = 1e-3,
                                .w_q = 8, .w_acc = .1, .w_qd = 1, .bias = 1, .w_force = 1}}},
    PEND16_FEW(5),
    PEND16_FEW(10),
    PEND16_FEW(20),
    PEND16_FEW(40),
    {.name = "pend16-narrow-ro", .kind = LAGRANGE, .system = TRUTH_PEND16_NARROW, .train = 200, .seeds = 2, REDUCED(64, .base = 0),
     .stage = {AE(10000, 128), ACC(90000, .1, 3e-3)}},
    NARROW("mlp", LATENT_MLP),
    NARROW("hnn", LATENT_HNN),
    NARROW("dhnn", LATENT_DHNN),
    NARROW("symoden", LATENT_SYMODEN),
    NARROW("comet", LATENT_COMET),

    GRID_OPINF("rope", TRUTH_ROPE, 100, 0),
    ROPE("n4", 1, 4, 80000, ROPE_SHORT),
    ROPE("n6", 1, 6, 80000, ROPE_SHORT),
    ROPE("n10", 2, 10, 200000, ROPE_LONG),
    ROPE("n14", 1, 14, 80000, ROPE_SHORT),
    GRID_OPINF("cloth", TRUTH_CLOTH, 60, 7e-5),
    CLOTH("n4", 7e-5, 0, 4, CLOTH_SHORT),
    CLOTH("n6", 7e-5, 0, 6, CLOTH_SHORT),
    CLOTH("n10", 7e-5, 0, 10, CLOTH_LONG),
    CLOTH("n14", 7e-5, 0, 14, CLOTH_SHORT),
    CLOTH("free-n10", 0, 1, 10, CLOTH_LONG),
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

void recipes_list(void)
{
    static const char *const system[TRUTH_SYSTEMS] = {
        [TRUTH_PEND2] = "pend2", [TRUTH_PEND2_ACT] = "pend2, torques", [TRUTH_PEND16] = "pend16",
        [TRUTH_PEND16_PD] = "pend16, PD torques", [TRUTH_PEND16_NARROW] = "pend16, starts of .3 rad", [TRUTH_ROPE] = "rope",
        [TRUTH_CLOTH] = "cloth",
    };
    for (int i = 0; i < recipes_count; i++)
        for (int s = 1; s <= recipes[i].seeds; s++) {
            printf("%s-%d ", recipes[i].name, s);
            if (recipes[i].parent) printf("%s-%d", recipes[i].parent, s);
            else printf("-");
            const enum truth_system w = recipes[i].system;
            printf(" %d %s\n", recipes[i].train, system[w] ? system[w] : truth_name(w));
        }
}
