/* SPDX-License-Identifier: MIT */
/* held_out.h - decides on the device whether an update of a model is accepted.

   Keep windows of motion that are never learned from: a start state, the torques, and the joints at the end. For each window
   compute the error of a roll-out with the weights in use, now [count], and with the updated weights, next [count]. Errors are
   >= 0. An error that cannot be computed is HELD_FAILED. count is 1 .. HELD_MOST.

   Errors are compared with the median of `now`. So with bad data in fewer than half of the windows the bounds stay within what
   good windows give. In the comparison such a window counts like any other, as HELD_FAR medians at most. It can refuse an update
   by a roll-out that newly fails. After a change of the machine the bounds follow as soon as more than half of the windows are
   newer than the change. */
#ifndef HELD_OUT_H
#define HELD_OUT_H

enum { HELD_MOST = 64, HELD_FAR = 16 }; /* HELD_FAR, in medians: a larger error is of bad data, or of a machine that has changed */
#define HELD_FAILED 1e9f

/* The median of e [count], at most HELD_MOST; the smaller one, if two are in the middle; 0 of none. NaN counts as HELD_FAILED.
   Cost: count^2 / 2 comparisons. */
static float held_median(int count, const float *e)
{
    float sorted[HELD_MOST] = {0};
    for (int i = 0; i < count; i++) {
        const float x = e[i] < HELD_FAILED ? e[i] : HELD_FAILED;
        int k = i;
        for (; k > 0 && sorted[k - 1] > x; k--)
            sorted[k] = sorted[k - 1];
        sorted[k] = x;
    }
    return sorted[(count - 1) / 2];
}

/* True if a window may be learned from that the weights in use predict with this error. False for NaN and HELD_FAILED. */
static int held_near(float error, int count, const float *now)
{
    return error < HELD_FAILED && error <= HELD_FAR * held_median(count, now);
}

/* True if the update is accepted. Errors beyond HELD_FAR medians count as HELD_FAR medians. HELD_FAILED or more, and NaN, are
   of roll-outs that fail: an update under which one newly fails is refused. The sum of squares must not grow. The windows that
   become better must outnumber those that become worse by count / 8, and by one at least. Nothing is better than a median of 0.
   So a single window may become worse, up to HELD_FAR medians, and any error beyond these may grow. */
static int held_no_worse(int count, const float *now, const float *next)
{
    const float middle = held_median(count, now);
    float change = 0;
    int better = 0;
    if (!(middle > 0)) return 0;
    for (int i = 0; i < count; i++) { /* in medians: no square is too small or too large */
        const float x = now[i] / middle, y = next[i] / middle;
        if (now[i] < HELD_FAILED && !(next[i] < HELD_FAILED)) return 0;
        const float a = x < HELD_FAR ? x : HELD_FAR, b = y < HELD_FAR ? y : HELD_FAR;
        change += b * b - a * a;
        better += (b < a) - (b > a);
    }
    return change <= 0 && better >= (count < 8 ? 1 : count / 8);
}

#endif
