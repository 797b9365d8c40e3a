/* SPDX-License-Identifier: MIT */
/* steady.c - one call of a function of firmware.c, by itself in the counts of gcov (steady.sh):
   steady tick|ahead|observe STATE, the number of a random state in the range seen in training. */
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
    f = argv[1][0] == 't' ? tick : argv[1][0] == 'a' ? ahead : observe;
    seed = (uint64_t)atoi(argv[2]);
    setup(NULL);
    must(tick());
    if (f == observe) { /* it starts, and moves on by one */
        const roln_noise noise = {.dt = 0.001f, .q = 1e-3f, .tau = 0.1f, .gate = 5, .lost = 3};
        observer.noise = noise;
        memcpy(observer.y, control.x.q, sizeof observer.y);
        must(observe());
    } else setup(NULL);
    __gcov_reset();
    must(f());
    __gcov_dump();
    _Exit(0);
}
