/* SPDX-License-Identifier: MIT */
/* three.c - three models of different sizes in one image. The kernels are there once; a model adds its weights, its scratch and a
   constant table. The chain has trained weights in flash; the others get random ones in RAM, the same from the same seed on every
   core and on the PC. Prints sizes and a hash of a roll-out of each. */

#include "chain.h"
#include "chain_weights.h"

#define ROLN_NAME finger /* two joints, full order: no autoencoder */
#define ROLN_AE 2
#define ROLN_MLP 16
#include "roln.h"

#define ROLN_NAME arm /* 16 joints, a mass matrix with a gyro layer, damping, the midpoint rule */
#define ROLN_AE 16, 12, 8, 4
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR midpoint
#define ROLN_LAYERS gyro
#define ROLN_DAMPING 1
#include "roln.h"

#include "text.h"

enum { STEPS = 20 };
#define TICK 0.005f /* s */

/* NAME_roll: encode a small pose, let it go, step, decode every state into *hash. */
#define ROLL(NAME) \
    static roln_status NAME##_roll(const NAME##_params *p, uint64_t *hash) \
    { \
        static NAME##_work work; \
        static NAME##_state x; \
        NAME##_latent s; \
        roln_status st; \
        for (int i = 0; i < NAME##_N; i++) \
            x.q[i] = 0.1f / (float)(i + 1); \
        st = NAME##_encode(p, &x, &s, &work.encode); \
        for (int k = 0; k < STEPS && st == ROLN_OK; k++) { \
            st = NAME##_step(p, &s, NULL, TICK, &work.step); \
            if (st == ROLN_OK) st = NAME##_decode(p, &s, &x, &work.decode); \
            *hash = roln_fnv((int)sizeof x, (const unsigned char *)&x, *hash); \
        } \
        return st; \
    }
ROLL(chain)
ROLL(finger)
ROLL(arm)

static void report(const char *name, size_t weights, size_t scratch, roln_status st, uint64_t hash)
{
    put_text(name);
    put_integer((uint32_t)weights, 8);
    put_integer((uint32_t)scratch, 8);
    put_text("  ");
    put_hex(hash, 16);
    put_text(st == ROLN_OK ? "\n" : " failed\n");
}

int main(void)
{
    static finger_params f;
    static finger_start f_start;
    static arm_params a;
    static arm_start a_start;
    uint64_t seed = 3, hash[3] = {ROLN_FNV, ROLN_FNV, ROLN_FNV};
    roln_status st[3] = {ROLN_OK, finger_init(&f, &seed, &f_start.init), arm_init(&a, &seed, &a_start.init)};
    st[0] = chain_roll(&chain_weights, &hash[0]);
    if (st[1] == ROLN_OK) st[1] = finger_roll(&f, &hash[1]);
    if (st[2] == ROLN_OK) st[2] = arm_roll(&a, &hash[2]);
    put_text("model  weights scratch  hash of a roll-out (sizes in bytes)\n");
    report("chain  ", sizeof chain_weights, sizeof(chain_work), st[0], hash[0]);
    report("finger ", sizeof f, sizeof(finger_work), st[1], hash[1]);
    report("arm    ", sizeof a, sizeof(arm_work), st[2], hash[2]);
    return st[0] != ROLN_OK || st[1] != ROLN_OK || st[2] != ROLN_OK;
}
