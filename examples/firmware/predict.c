/* SPDX-License-Identifier: MIT */
/* predict.c - prediction with the weights in flash: encode a measured state, look a second ahead, decode. Prints the joints and a
   hash of all the states on the way, which is the same on every core and on the PC.

   sh cc.sh m4 predict.c -o predict.elf && sh run.sh m4 predict.elf */

#include "chain.h"
#include "chain_weights.h" /* static const: flash */
#include "text.h"

enum { STEPS = 200 };
#define TICK 0.005f /* s */

static chain_work work; /* RAM */

int main(void)
{
    chain_state x = {{0.3f, 0.05f, -0.02f, 0.01f, 0.4f}, {0}}; /* measured q, qd */
    chain_latent s;
    uint64_t hash = ROLN_FNV;
    uint32_t most = 0;
    if (chain_encode(&chain_weights, &x, &s, &work.encode) != ROLN_OK) return 1;
    for (int k = 0; k < STEPS; k++) {
        const uint32_t before = board_count();
        if (chain_step(&chain_weights, &s, NULL, TICK, &work.step) != ROLN_OK) return 1;
        const uint32_t count = board_count() - before;
        if (count > most) most = count;
        hash = roln_fnv((int)sizeof s, (const unsigned char *)&s, hash);
    }
    if (chain_decode(&chain_weights, &s, &x, &work.decode) != ROLN_OK) return 1;
    put_text("q, rad:");
    for (int i = 0; i < chain_N; i++)
        put_real(x.q[i], 4);
    put_text("\nhash ");
    put_hex(hash, 16);
    put_text("\ninstructions of a step ");
    put_integer(most, 0);
    put_text("\n");
    return 0;
}
