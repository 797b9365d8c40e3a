/* SPDX-License-Identifier: MIT */
/* scratch.h - scratch is exact: what the calls of a function write of it, against what its type declares. Include after small.h. */
#ifndef SCRATCH_H
#define SCRATCH_H

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

static scratch_sizes used; /* the most of its scratch that any call of a function has written */

#define USE(function, call) \
    do { \
        roln_real *const work = ROOM(function); \
        CHECK_OK(call); \
        ROOM_KEPT(); \
        if (room_used() > used.function) used.function = room_used(); \
    } while (0)

/* Evidence, L = I, of more terms than any small model has: a guard that looks at novelty asks for all of its scratch. */
ROLN_FN const roln_real *all_known(void)
{
    enum { TERMS_MAX = 200 };
    static roln_real L[ROLN_TRI(TERMS_MAX)];
    int i;
    for (i = 0; i < TERMS_MAX; i++)
        L[ROLN_TRI(i) + i] = 1;
    return L;
}

/* Numbers that no call writes: two, for rounding of sizes, but for what is said here. */
ROLN_FN int unwritten(int k, const char *function)
{
    /* arrays of no numbers have one each: those of the force on a model without an autoencoder; sums in double are aligned */
    if (models[k]->md->ae.layers == 0 && (strcmp(function, "fit_inertia") == 0 || strcmp(function, "force_variance") == 0))
        return 4;
    if (models[k]->md->ae.layers == 0 && strcmp(function, "reduce") == 0) return 4;
    /* it has the scratch of a guard that looks at novelty, at which it looks by itself: without the decoded state */
    if (strcmp(function, "fit_limits") == 0) return 2 * (N_OF(k) + n_OF(k)) + 2;
    /* it has the scratch of a tick, and of a load it needs less */
    if (models[k]->load && strcmp(function, "fit_noise") == 0) return 16;
    return 2;
}

/* Every function with scratch, with all that makes it take more: its hungriest call writes as many numbers as are declared. */
ROLN_FN void check_exact(int k, const char *function, int declared, int written)
{
    if (!CHECK(written <= declared && written >= declared - unwritten(k, function)))
        printf("    %s_%s: scratch of %d numbers declared, %d written\n", models[k]->name, function, declared, written);
}
#define CHECK_EXACT(function) check_exact(k, #function, models[k]->scratch.function, used.function);

/* Parameters theta of model k that encode and decode, and numbers x [256]. The state after it. */
ROLN_FN uint64_t scratch_start(int k, roln_real *theta, roln_real *x)
{
    uint64_t s = 500 + (uint64_t)k;
    memset(&used, 0, sizeof used);
    parameters(k, &s, theta);
    CHECK_OK(roln_ae_init(&models[k]->md->ae, theta, &s, ROOM(init)));
    dyadic(256, ROLN_C(0.5), &s, x);
    return s;
}

#endif
