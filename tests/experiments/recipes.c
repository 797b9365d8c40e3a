/* recipes.c - the run list. */
#include <stdlib.h>
#include <string.h>

#include "recipes.h"

/* Shapes: {autoencoder}, width of the networks, head, base, damping, {SPD layers}, slope, zoom. */
#define NONE {{0}, 0, 0, 0, 0, {0}, 0, 0}
#define NET2(head, base, layer) {{2}, 64, head, base, 0, {layer}, .6, 1}
#define NET16(head, slope, ...) {{__VA_ARGS__}, 64, head, 0, 0, {0}, slope, 1}
#define RO16(head) NET16(head, .6, 16, 16, 16, 16, 12, 8, 4)

/* Stages: the autoencoder alone; the acceleration loss; the ODE loss over windows of H steps of `stride` samples. */
#define AE(updates, batch) {STAGE_AE, updates, batch, 0, 1, .1, 0, 1e-3, 2, 0, 0, 1, 1, 0, 0}
#define ACC(updates, lr_ae, lr_net) {STAGE_ACC, updates, 64, 0, 1, lr_ae, lr_net, 1e-3, 2, .1, 0, 1, 1, 0, 0}
#define ACC1(updates, lr_net) {STAGE_ACC, updates, 64, 0, 1, 0, lr_net, 1e-3, 1, 1, 0, 1, 1, 0, 0} /* no autoencoder */
#define ODE(updates, H, stride, lr_ae, lr_net) {STAGE_ODE, updates, 64, H, stride, lr_ae, lr_net, 1e-3, 2, 0, 0, 1, 1, 0, 0}
#define LONG_ODE(updates, H, stride, lr_ae, lr_net) {STAGE_ODE, updates, 32, H, stride, lr_ae, lr_net, 1e-3, 2, 0, 1, 1, 1, 0, 0}

/* Equal budgets of samples: pend2 2.56 million, pend16 20 million; an update of the ODE loss costs 64 (H + 1) samples. */
#define PEND2(name, train, seeds, shape, ...) {name, LAGRANGE, TRUTH_PEND2_ACT, train, 1, seeds, 0, NULL, 0, 0, shape, {__VA_ARGS__}}
#define PEND2_BOTH(name, head, base, layer) \
    PEND2("pend2-" name "-acc", 40, 5, NET2(head, base, layer), ACC1(40000, 5e-3)), \
    PEND2("pend2-" name "-ode", 40, 5, NET2(head, base, layer), ACC1(30000, 5e-3), ODE(1111, 8, 5, 0, 1.5e-3))
#define PEND2_FEW(train, text) \
    PEND2("pend2-few" text "-exp", train, 5, NET2(ROLN_EXPONENTIAL, 0, 0), ACC1(40000, 5e-3)), \
    PEND2("pend2-few" text "-chol", train, 5, NET2(ROLN_CHOLESKY, 0, 0), ACC1(40000, 5e-3)), \
    {"pend2-few" text "-mlp", LATENT, TRUTH_PEND2_ACT, train, 1, 5, 0, "pend2-few" text "-exp", LATENT_MLP, 0, NONE, \
     {ACC1(40000, 5e-3)}}

#define PEND16(name, train, seeds, shape, ...) {name, LAGRANGE, TRUTH_PEND16, train, 0, seeds, 0, NULL, 0, 0, shape, {__VA_ARGS__}}
#define PEND16_LATENT(name, train, seeds, updates, parent, kind) \
    {name, LATENT, TRUTH_PEND16, train, 0, seeds, 0, parent, kind, 0, NONE, {ACC1(updates, 3e-3)}}
#define PEND16_FEW(train, text) \
    PEND16("pend16-few" text "-ro", train, 3, RO16(ROLN_EXPONENTIAL), AE(10000, 128), ACC(90000, .1, 3e-3)), \
    PEND16("pend16-few" text "-full", train, 3, NET16(ROLN_EXPONENTIAL, .6, 16), ACC1(110000, 3e-3)), \
    PEND16_LATENT("pend16-few" text "-mlp", train, 3, 90000, "pend16-few" text "-ro", LATENT_MLP)
/* Learned from starts of .3 rad, tested from .5. */
#define NARROW(name, shape, ...) {name, LAGRANGE, TRUTH_PEND16_NARROW, 200, 0, 3, 0, NULL, 0, 0, shape, {__VA_ARGS__}}
#define NARROW_LATENT(name, kind) \
    {name, LATENT, TRUTH_PEND16_NARROW, 200, 0, 3, 0, "pend16-narrow-ro", kind, 0, NONE, {ACC1(90000, 3e-3)}}
/* Rope and cloth are trained in POD coordinates. Positions count more than velocities, in which vibrations that n coordinates do
   not hold are a twentieth and more; accelerations of the rope come from a parabola through 21 ms, across these vibrations. The
   windows of the ODE loss grow until they are as long as a trajectory. */
#define WIDE_AE(updates) {STAGE_AE, updates, 64, 0, 1, .3, 0, 1e-3, 50, 0, 0, 1, .01, 0, 0}
#define WIDE_ACC(updates) {STAGE_ACC, updates, 64, 0, 1, .02, 3e-3, 1e-3, 50, .003, 0, .1, .01, 0, 10}
#define WIDE_ODE(updates, batch, H, stride, lr_ae, lr_net, w_qd) \
    {STAGE_ODE, updates, batch, H, stride, lr_ae, lr_net, 1e-3, 50, 0, 10, w_qd, .01, 0, 0}
#define ROPE(name, seeds, n, ...) \
    {name, LAGRANGE, TRUTH_ROPE, 100, 0, seeds, 48, NULL, 0, 0, \
     {{48, 48, 48, 48, 48, 48, 48, 48, n}, 64, ROLN_EXPONENTIAL, 0, 0, {0}, .6, 6.7}, {WIDE_AE(100000), __VA_ARGS__}}
#define ROPE_LONG \
    WIDE_ACC(120000), WIDE_ODE(4000, 32, 8, 10, .01, 2e-3, .1), WIDE_ODE(3000, 32, 25, 20, .005, 1e-3, .1), \
    WIDE_ODE(2000, 16, 49, 20, .003, 1e-3, .1)
#define ROPE_SHORT WIDE_ACC(60000), WIDE_ODE(4000, 32, 8, 10, .01, 2e-3, .1)
#define CLOTH(name, force, damping, n, ...) \
    {name, LAGRANGE, TRUTH_CLOTH, 60, force, 1, 48, NULL, 0, 0, \
     {{48, 48, 48, 48, 48, 32, n}, 64, ROLN_EXPONENTIAL, 0, damping, {0}, .6, 3.3}, {WIDE_AE(60000), __VA_ARGS__}}
#define CLOTH_SHORT WIDE_ODE(8000, 64, 2, 5, .005, 3e-3, .3), WIDE_ODE(6000, 32, 8, 5, .01, 2e-3, .3)
#define CLOTH_LONG CLOTH_SHORT, WIDE_ODE(3000, 32, 25, 5, .005, 1e-3, .3), WIDE_ODE(3000, 16, 49, 5, .003, 1e-3, .3)
#define OPINF16(name, kind) {name, kind, TRUTH_PEND16, 200, 0, 1, 0, NULL, 0, 4, NONE, {{0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0}}}

const struct recipe recipes[] = {
    PEND2_BOTH("exp", ROLN_EXPONENTIAL, 0, 0),
    PEND2_BOTH("base", ROLN_EXPONENTIAL, 1, 0),
    PEND2_BOTH("gyro", ROLN_EXPONENTIAL, 0, ROLN_GYRO),
    PEND2_BOTH("basegyro", ROLN_EXPONENTIAL, 1, ROLN_GYRO),
    PEND2_BOTH("chol", ROLN_CHOLESKY, 0, 0),
    PEND2_FEW(5, "5"),
    PEND2_FEW(10, "10"),
    PEND2_FEW(20, "20"),
    PEND2_FEW(40, "40"),

    PEND16("pend16-acc", 200, 5, RO16(ROLN_EXPONENTIAL), AE(20000, 128), ACC(270000, .1, 3e-3)),
    PEND16("pend16-ode", 200, 5, RO16(ROLN_EXPONENTIAL), AE(20000, 128), ACC(180000, .1, 3e-3), ODE(10000, 8, 5, .03, 1e-3)),
    PEND16("pend16-chol", 200, 5, RO16(ROLN_CHOLESKY), AE(20000, 128), ACC(270000, .1, 3e-3)),
    PEND16("pend16-seq", 200, 5, RO16(ROLN_EXPONENTIAL), AE(75000, 128), ACC(160000, 0, 3e-3)),
    PEND16("pend16-pod", 200, 5, NET16(ROLN_EXPONENTIAL, 1, 16, 4), ACC(310000, 0, 3e-3)),
    PEND16("pend16-full", 200, 5, NET16(ROLN_EXPONENTIAL, .6, 16), ACC1(310000, 3e-3)),
    PEND16("pend16-fullchol", 200, 5, NET16(ROLN_CHOLESKY, .6, 16), ACC1(310000, 3e-3)),
    OPINF16("pend16-opinf", OPINF),
    OPINF16("pend16-opinfaffine", OPINF_AFFINE),
    PEND16_LATENT("pend16-mlp", 200, 5, 270000, "pend16-acc", LATENT_MLP),
    PEND16_LATENT("pend16-hnn", 200, 5, 270000, "pend16-acc", LATENT_HNN),
    PEND16_LATENT("pend16-dhnn", 200, 5, 270000, "pend16-acc", LATENT_DHNN),
    PEND16_LATENT("pend16-symoden", 200, 5, 270000, "pend16-acc", LATENT_SYMODEN),
    PEND16_LATENT("pend16-comet", 200, 5, 270000, "pend16-acc", LATENT_COMET),
    {"pend16-long", LAGRANGE, TRUTH_PEND16, 1000, 0, 5, 0, NULL, 0, 0,
     {{16, 16, 16, 16, 16, 12, 8, 4}, 96, ROLN_EXPONENTIAL, 0, 0, {0}, .6, 1},
     {AE(20000, 128), ACC(400000, .1, 3e-3), ACC(300000, .04, 2.5e-3), LONG_ODE(8000, 25, 10, .01, 1e-3),
      LONG_ODE(6000, 50, 20, .005, 5e-4)}},
    {"pend16-pd", LAGRANGE, TRUTH_PEND16_PD, 200, 1, 3, 0, NULL, 0, 0, RO16(ROLN_EXPONENTIAL),
     {AE(20000, 128), {STAGE_ACC, 270000, 64, 0, 1, .05, 3e-3, 1e-3, 8, .1, 0, 1, 1, 1, 0}}},
    PEND16_FEW(5, "5"),
    PEND16_FEW(10, "10"),
    PEND16_FEW(20, "20"),
    PEND16_FEW(40, "40"),
    NARROW("pend16-narrow-ro", RO16(ROLN_EXPONENTIAL), AE(10000, 128), ACC(90000, .1, 3e-3)),
    NARROW_LATENT("pend16-narrow-mlp", LATENT_MLP),
    NARROW_LATENT("pend16-narrow-hnn", LATENT_HNN),
    NARROW_LATENT("pend16-narrow-dhnn", LATENT_DHNN),
    NARROW_LATENT("pend16-narrow-symoden", LATENT_SYMODEN),
    NARROW_LATENT("pend16-narrow-comet", LATENT_COMET),

    ROPE("rope-n4", 1, 4, ROPE_SHORT),
    ROPE("rope-n6", 1, 6, ROPE_SHORT),
    ROPE("rope-n10", 2, 10, ROPE_LONG),
    ROPE("rope-n14", 1, 14, ROPE_SHORT),
    CLOTH("cloth-n4", 7e-5, 0, 4, CLOTH_SHORT),
    CLOTH("cloth-n6", 7e-5, 0, 6, CLOTH_SHORT),
    CLOTH("cloth-n10", 7e-5, 0, 10, CLOTH_LONG),
    CLOTH("cloth-n14", 7e-5, 0, 14, CLOTH_SHORT),
    CLOTH("cloth-free-n10", 0, 1, 10, CLOTH_LONG),
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
    for (int i = 0; i < recipes_count; i++)
        for (int s = 1; s <= recipes[i].seeds; s++) {
            printf("%s-%d ", recipes[i].name, s);
            if (recipes[i].parent) printf("%s-%d\n", recipes[i].parent, s);
            else printf("-\n");
        }
}
