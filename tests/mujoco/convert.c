/* SPDX-License-Identifier: MIT */
/* convert - recordings in HDF5 become the CSV that examples/train.c reads.

     convert IN.h5 OUT.csv [q=NAME] [qd=NAME] [force=NAME] [t=NAME] [data=GROUP] [states=N] [dt=S]

   Layouts, of which the first that fits is taken:
     groups demo_0, demo_1 .. in /data (data=), as record, robomimic and MuJoCo's own tools write them; /mask is not read
     arrays of equally long recordings [count,S,N] in /train, /test, /tune, as generate writes them: all of them, in this order
   Inside a recording, unless a name is given:
     q       q, qpos, obs/q, obs/qpos, obs/robot0_joint_pos, obs/joint_pos          qd likewise
     force   tau_model, tau, u, obs/tau, ctrl, actions: columns tau if there are N of them and they are called tau, else u; if
             there is none, or the name is empty, no such columns
     t       t, time, obs/t, obs/time; else dt= is needed
   states=N: q and qd of the first N joints are columns 1 .. 2N of `states`, MuJoCo's state of a machine of N joints, t is column 0.
   Quaternions (ball and free joints) are no joints: they must be left out of q. Exit code 1: said in the last lines. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "demos.h"

static int usage(void)
{
    fprintf(stderr, "convert IN.h5 OUT.csv [q=NAME] [qd=NAME] [force=NAME] [t=NAME] [data=GROUP] [states=N] [dt=S]\n");
    return 1;
}

int main(int argc, char **argv)
{
    layout want = {NULL, NULL, NULL, NULL, NULL, 0, 0};
    const struct {
        const char *key, **to;
    } words[] = {{"q=", &want.q}, {"qd=", &want.qd}, {"force=", &want.force}, {"t=", &want.t}, {"data=", &want.data}};
    demos d;
    if (argc < 3) return usage();
    for (int i = 3; i < argc; i++) {
        size_t k = 0;
        while (k < 5 && strncmp(argv[i], words[k].key, strlen(words[k].key))) k++;
        if (k < 5) *words[k].to = argv[i] + strlen(words[k].key);
        else if (!strncmp(argv[i], "states=", 7) && atoi(argv[i] + 7) > 0) want.states = atoi(argv[i] + 7);
        else if (!strncmp(argv[i], "dt=", 3) && atof(argv[i] + 3) > 0) want.dt = atof(argv[i] + 3);
        else return fprintf(stderr, "%s: no such setting, or no positive number\n", argv[i]), usage();
    }
    if (demos_read_h5(&d, &want, argv[1])) return 1;
    for (int k = 0; k < d.count; k++) d.demo[k].test = 0;
    const int bad = demos_write_csv(&d, 0, argv[2]);
    if (!bad) printf("%s: %d recordings of %d joints, %d columns %s\n", argv[2], d.count, d.N, d.forces, d.inputs ? "u" : "tau");
    demos_free(&d);
    return bad != 0;
}
