/* SPDX-License-Identifier: MIT */
/* limits.c - OUT_limits.h of a motor in a program, in C and C++: limits RECORDINGS FROM

   -DCONFIG, -DWEIGHTS and -DLIMITS name the three headers of a model called motor, of one joint with a torque. RECORDINGS is a CSV
   of t, q, qd, tau with a blank line between recordings. Those from number FROM on, counted from 1, pass filter and observer, the
   guard with the torque that was recorded, and a tick that follows them. All others have half of the largest novelty at most. Exit
   code 0: no tick has a fault. */
#include CONFIG
#include WEIGHTS
#include LIMITS
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static motor_filter filter;
static motor_observer observer;
static motor_guard guarded, driven;
static motor_filter_tick_work filterwork;
static motor_observer_tick_work observerwork;
static motor_doubts doubts;
static motor_work work;

/* Nonzero if twice the novelty of a sample is beyond its limit. */
static int is_new(double q, double qd)
{
    const motor_state x = {{(roln_real)q}, {(roln_real)qd}};
    motor_latent s;
    return motor_encode(&motor_weights, &x, &s, &work.encode) != ROLN_OK ||
           motor_doubt(&motor_weights, &motor_known, &s, &doubts, &work.doubt) != ROLN_OK ||
           !(2 * doubts.novelty <= motor_limits.novelty);
}

/* The faults of one sample. */
static unsigned tick(double q, double qd, double tau, const roln_real *before)
{
    const roln_real y[1] = {(roln_real)q}, want[1] = {(roln_real)tau}, none[1] = {0};
    motor_state x = {{(roln_real)q}, {(roln_real)qd}};
    motor_latent s;
    motor_target r;
    unsigned bits = motor_filter_tick(&motor_weights, &motor_noise, y, before, &filter, &filterwork);
    bits |= motor_observer_tick(&motor_weights, &motor_steady_gains, y, before, &observer, &observerwork);
    bits &= ~(ROLN_FILTER_START | ROLN_FAULT_RANGE); /* motion leaves the range of training, which the filter has without margin */
    if (motor_encode(&motor_weights, &x, &s, &work.encode) != ROLN_OK) return ROLN_FAULT_STATUS;
    if (motor_doubt(&motor_weights, &motor_known, &s, &doubts, &work.doubt) != ROLN_OK) return ROLN_FAULT_STATUS;
    if (motor_limits.evidence != motor_known.L || !(doubts.novelty <= motor_limits.novelty)) return ROLN_FAULT_RANGE;
    if (!(doubts.zdd[0] > 0) || !(doubts.force[0] > 0)) return ROLN_FAULT_STATUS;
    bits |= motor_guard_tick(&motor_weights, &motor_limits, &x, &s, want, &guarded, &work.guard_tick);
    memset(&r, 0, sizeof r);
    if (motor_encode_reference(&motor_weights, x.q, x.qd, none, &r, &work.encode_reference) != ROLN_OK) return ROLN_FAULT_STATUS;
    driven.g.valid = 0; /* another torque than the recorded one does not explain the recorded motion */
    return bits | (motor_tick(&motor_weights, &motor_limits, &x, &r, &s, &driven, &work.tick) & ~ROLN_CLIPPED);
}

int main(int argc, char **argv)
{
    FILE *const f = argc > 2 ? fopen(argv[1], "r") : NULL;
    const int from = argc > 2 ? atoi(argv[2]) : 0;
    roln_real tau_before[1] = {0};
    char line[200];
    int recording = 1, ticks = 0, bad = 0, first = 1;
    if (!f) return 1;
    while (fgets(line, sizeof line, f)) {
        double t, q, qd, tau;
        if (sscanf(line, "%lf,%lf,%lf,%lf", &t, &q, &qd, &tau) < 4) {
            recording++, first = 1;
            memset(&filter, 0, sizeof filter), memset(&observer, 0, sizeof observer);
            memset(&guarded, 0, sizeof guarded), memset(&driven, 0, sizeof driven);
            continue;
        }
        if (recording < from) {
            if (is_new(q, qd) && bad++ == 0) printf("recording %d, t = %g: novelty %g\n", recording, t, (double)doubts.novelty);
            continue;
        }
        if (first)
            guarded.tau[0] = (roln_real)tau; /* else the limit of rate lets the torque begin at 0, as none of the recordings */
        {
            const unsigned bits = tick(q, qd, tau, first ? NULL : tau_before);
            if (bits && bad++ == 0) printf("recording %d, t = %g: %s\n", recording, t, roln_fault_text(bits));
        }
        tau_before[0] = (roln_real)tau, first = 0, ticks++;
    }
    fclose(f);
    printf("%d ticks, %d samples with a fault\n", ticks, bad);
    return ticks > 0 && bad == 0 ? 0 : 1;
}
