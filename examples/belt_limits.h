/* Limits of a guard and noise of a filter for the weights that were written with it, fitted to held-out recordings.
   Include it behind the header of the config. */
#ifndef belt_limits_h
#define belt_limits_h
typedef char belt_limits_are_of_N_3[belt_N == 3 && belt_force_size == 3 ? 1 : -1];

/* Limits of NAME_tick, from 8125 ticks of held-out recordings, which are smooth: a controller changes torques faster, and its residual is larger. */
static const roln_real belt_limits_tau[belt_force_size] = {
    ROLN_C(48.041172), /* motor 1, unit as it is: the largest that was recorded, which may be less than the motor can */
    ROLN_C(11.391366), /* motor 2, unit as it is: the largest that was recorded, which may be less than the motor can */
    ROLN_C(0.0), /* motor 3, unit as it is: no torque was recorded */
};
static const roln_real belt_limits_rate[belt_force_size] = {
    ROLN_C(439.9731), /* motor 1, unit as it is per s: the largest change from sample to sample that was recorded */
    ROLN_C(113.39564), /* motor 2, unit as it is per s: the largest change from sample to sample that was recorded */
    ROLN_C(0.0), /* motor 3, unit as it is per s: no torque was recorded */
};
static const roln_limits belt_limits = {
    ROLN_C(0.001), /* dt, s: step of the recordings; the tick of your controller */
    ROLN_C(0.1), /* margin, part of the range of z, zd: 4 times what was needed, 0.1 at least */
    ROLN_C(2.3735025), /* residual, unit of tau times that of qd: 4 times the largest of the recordings */
    ROLN_C(48.041172), /* tau, as it is: not used, for tau_each is */
    5, /* hold, ticks: a usual number, not fitted */
    ROLN_C(0.0), /* q_tolerance: no check, z is all of q */
    ROLN_C(0.0), /* qd_tolerance: no check, zd is all of qd */
    8, /* residual_window, ticks: a usual number, not fitted */
    0, /* strict: torques beyond a limit are clipped */
    ROLN_C(439.9731), /* rate, as it is per s: not used, for rate_each is */
    belt_limits_tau, /* tau_each */
    belt_limits_rate, /* rate_each */
    0, /* safe: no torque once the guard has expired; an array of yours holds an arm up */
    0, /* motors: at each joint, or the learned inputs */
    0, /* evidence: none, novelty is not checked */
    ROLN_C(0.0), /* novelty: not checked */
    ROLN_C(0.0) /* false_alarms: none, residual is a fixed limit */
};

/* Noise of NAME_filter_tick, from 2015 ticks of held-out recordings. */
static const roln_real belt_noise_q[belt_N] = {
    ROLN_C(0.000110673165), /* joint 1, unit as it is: the noise that the spectrum shows, and what the model leaves of q */
    ROLN_C(0.00010619622), /* joint 2, unit as it is: the noise that the spectrum shows, and what the model leaves of q */
    ROLN_C(0.00010377182), /* joint 3, unit as it is: the noise that the spectrum shows, and what the model leaves of q */
};
static const roln_real belt_noise_tau[belt_N] = {
    ROLN_C(2.3540614), /* motor 1, unit as it is: torque that the model does not know, in proportion to what it leaves of that joint's torque */
    ROLN_C(1.5093281), /* motor 2, unit as it is: torque that the model does not know, in proportion to what it leaves of that joint's torque */
    ROLN_C(0.09261831), /* motor 3, unit as it is: torque that the model does not know, in proportion to what it leaves of that joint's torque */
};
static const roln_noise belt_noise = {
    ROLN_C(0.001), /* dt, s: step of the recordings; the tick of your controller */
    ROLN_C(0.000110673165), /* q, as it is: not used, for q_each is */
    ROLN_C(2.3540614), /* tau, as it is: not used, for tau_each is */
    ROLN_C(6.0), /* gate, deviations: a usual number, not fitted */
    5, /* lost, ticks: a usual number, not fitted */
    belt_noise_q, /* q_each */
    belt_noise_tau, /* tau_each */
    ROLN_C(0.0), /* load: no load is estimated */
};

#endif
