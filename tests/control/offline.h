/* SPDX-License-Identifier: MIT */
/* offline.h - the best that was found: OFFLINE_STEPS steps at once, iterated to the end, in double, on the model of
   swift.h. */
#ifndef OFFLINE_H
#define OFFLINE_H

enum { OFFLINE_STEPS = 60 };

struct offline {
    double start[8];         /* z, zd */
    double q[16];            /* joints to reach, at rest */
    double limit;            /* of each motor, Nm */
    double P[64], end[8];    /* cost (s - end)^T P (s - end) of what comes after the last step */
};

/* All numbers of swift_params. 0, or -1: they are not as many. */
int offline_load(int count, const float *numbers);

/* The cost of torques u [OFFLINE_STEPS][4], and the least that is found by Newton's method from there on; NAN: a step failed. */
double offline_cost(const struct offline *o, const float *u);
double offline_best(const struct offline *o, const float *u);

#endif
