/* SPDX-License-Identifier: MIT */
/* states.h - states in the range seen in training, with references, for what measures firmware.c; behind text.h instructions,
   too. */
#ifndef STATES_H
#define STATES_H

#include "firmware.h"

static uint64_t seed = 1;
static M(work) work;

/* What must not happen: said and done by the program. */
static void give_up(const char *text);

static void must(roln_status st)
{
    if (st != ROLN_OK) give_up("a status other than ROLN_OK\n");
}

static roln_real between(roln_real a, roln_real b)
{
    return a + (b - a) * roln_uniform(&seed);
}

static void draw(M(latent) *s)
{
    for (int i = 0; i < n; i++) {
        s->z[i] = between(weights->z_min[i], weights->z_max[i]);
        s->zd[i] = between(-weights->zd_max[i], weights->zd_max[i]);
    }
}

/* A state that is measured, at z if not NULL, and a reference. */
static void setup(const roln_real *z)
{
    M(latent) s, ref;
    draw(&s), draw(&ref);
    if (z) memcpy(s.z, z, sizeof s.z);
    must(M(decode)(weights, &s, &control.x, &work.decode));
    for (int i = 0; i < n; i++) {
        control.ref.z[i] = ref.z[i], control.ref.zd[i] = ref.zd[i];
        control.ref.zdd[i] = between(-weights->zd_max[i], weights->zd_max[i]);
        control.ref.kp[i] = control.ref.kd[i] = 1;
    }
}

#ifdef TEXT_H
static void give_up(const char *text)
{
    put_text(text);
    board_exit(1);
}

static void print(const char *what, uint32_t a, uint32_t b)
{
    put_text(what);
    put_integer(a, 10);
    put_integer(b, 10);
    put_text("\n");
}

static roln_status nothing(void)
{
    return ROLN_OK;
}

static uint32_t count(roln_status (*volatile f)(void))
{
    const uint32_t before = board_count();
    const roln_status st = f();
    const uint32_t used = board_count() - before;
    must(st);
    return used;
}
#endif

#endif
