/* SPDX-License-Identifier: MIT */
/* steady.c - one call of a function of firmware.c, by itself in the counts of gcov (steady.sh):
   steady tick|ahead|filter|observe STATE, the number of a random state in the range seen in training. */
#include <stdio.h>
#include <stdlib.h>

#include "states.h"

void __gcov_reset(void), __gcov_dump(void);

static void give_up(const char *text)
{
    fputs(text, stderr);
    exit(1);
}

int main(int argc, char **argv)
{
    roln_status (*f)(void);
    if (argc != 3) return 1;
    f = argv[1][0] == 't' ? tick : argv[1][0] == 'a' ? ahead : argv[1][0] == 'f' ? filter : observe;
    seed = (uint64_t)atoi(argv[2]);
    setup(NULL);
    must(tick());
    if (f == filter || f == observe) { /* it starts, and moves on by one */
        const roln_noise noise = {.dt = 0.001f, .q = 1e-3f, .tau = 0.1f, .gate = 5, .lost = 3};
        estimates.noise = noise;
        estimates.gains.dt = noise.dt, estimates.gains.gate = noise.gate, estimates.gains.lost = noise.lost;
        for (int i = 0; i < N; i++)
            estimates.gains.q[i] = noise.q, estimates.gains.e[i] = 2 * noise.q;
        memcpy(estimates.y, control.x.q, sizeof estimates.y);
        must(f());
    } else setup(NULL);
    __gcov_reset();
    must(f());
    __gcov_dump();
    _Exit(0);
}
