/* SPDX-License-Identifier: MIT */
/* roln.h - reduced-order Lagrangian neural networks: learn a small mechanical model from motion, run it in firmware.

   Define the model, include this file; include it again with other definitions for the next model.

       #define ROLN_NAME    arm               prefix of every generated name
       #define ROLN_AE      16, 12, 8, 4      N, hidden .., n: autoencoder; a single number: no autoencoder, N = n
       #define ROLN_MLP     64, 64            hidden widths of the networks
       #define ROLN_POLYNOMIALS 4, 7          in place of ROLN_MLP: polynomials, of degree 4 for the mass matrix and damping, of
                                              degree 7 for the potential energy; degrees are 2 .. 8
       #define ROLN_INTEGRATOR rk4            euler, leapfrog, rk4 or midpoint; default rk4
       #define ROLN_FILTER model              how NAME_filter_tick looks a tick ahead: model, by its integrator, default; leapfrog,
                                              by one evaluation, for ticks that are short against friction
       #define ROLN_SLOPE   0.41421356        slope k of the activation, in (0, 1], default tan(pi/8); 1: none, all linear
       #define ROLN_CHART   polynomial, 3     the innermost layer has a linear encoder and a decoder that is polynomial to this
                                              degree, 2 .. 8, in place of the activation; default none
       #define ROLN_MASS    exponential       mass matrix: exponential, exp_P(U); cholesky, L L^T + floor I with L lower triangular;
                                              or squares, 6: the same with all of L learned, 6 columns; n or more are needed
       #define ROLN_BASE    0                 1: learned base point P of the exponential; default 0, P = I
       #define ROLN_LAYERS  gyro, gyro        SPD layers behind the exponential: gyro, 4 at most; default none
       #define ROLN_EIGENVALUE_FLOOR 1e-4     smallest eigenvalue that cholesky and squares allow
       #define ROLN_DAMPING 0                 1: learned dissipation R(z) zd; 2: and quadratic drag W(z) (|y| o y), y = W^T zd, o:
                                              number by number; default 0
       #define ROLN_FRICTION 0                1: learned dry friction c_j tanh(zd_j / v_j) of each latent coordinate; 2: its level
                                              also depends on direction, low velocity (Stribeck) and gravity (roln_friction);
                                              default 0
       #define ROLN_STICTION 0                1: dry friction can hold a joint exactly, in NAME_step, NAME_linear and all
                                              that predicts with them. Needs ROLN_FRICTION, and no leapfrog filter. Training is
                                              the same
       #define ROLN_ANGLES  1, 0              for each joint, 1: it is an angle in radians and may turn round, 0: it is not; without
                                              autoencoder, at most 31 joints; default: none is
       #define ROLN_SCALE   each              each joint has a unit of its own, fitted to its motion: for joints of different kinds,
                                              metres beside radians; default common, all have the same
       #define ROLN_INPUTS  0                 number of inputs u of a learned input map, tau = B u; default 0: tau is given
       #define ROLN_ACTUATOR torque           what the input of a joint is. torque: tau itself, default. current: a motor current u
                                              or any command proportional to torque, tau = k u + o. servo: the position u that a
                                              PD controller in the drive follows, tau = k (u - q) - d qd + o. k, d > 0 and o are
                                              learned for each joint
       #define ROLN_DRIVEN  0                 the last so many joints are driven: their motion is prescribed, as of a moving base
                                              or of held ends. Their input is their acceleration. With an autoencoder they are
                                              the last latent coordinates; it is one layer with a chart, full weights, and LEARN
                                              networks. Without midpoint, INPUTS, ACTUATOR, LOAD; default 0
       #define ROLN_HORIZON 8                 longest training window in steps; default 8
       #define ROLN_BLOCK   16                training windows computed together (memory against speed); default 16
       #define ROLN_PLAN    20, 4             steps of a plan, motors; default 0: NAME_plan_.. is not generated
       #define ROLN_GN_ROWS 4000              rows of a step of Gauss-Newton; default 0: NAME_newton_.. is not generated
       #define ROLN_LEARN   networks          what it moves: networks, all behind the autoencoder, or everything; default networks
       #define ROLN_LOAD    0                 1: NAME_filter_tick estimates a constant force on z, too, such as of a payload, which
                                              the references of NAME_control may take up
       #define ROLN_DELAY   0                 ticks from a torque that is sent to its effect: NAME_tick computes the torque for the
                                              state so far ahead, under the torques on their way; default 0
       #define ROLN_QUANTISE int8             weights of the autoencoder in flash: full, half, int8; default full. half and int8
                                              predict and control; NAME_quantise makes them from a model trained with full
       #include "roln.h"

   For all models of a file, before the first header of roln (roln_spd.h, 1 configuration): ROLN_DOUBLE, ROLN_FN, ROLN_CODE,
   ROLN_FLASH, ROLN_SIMD, ROLN_FENCE.

   Letters: q, qd, qdd [N] joints and their derivatives in time; z, zd, zdd [n] latent coordinates, z = rho(q), q = phi(z);
   D = drho/dq [n][N], J = dphi/dz [N][n], D J = I; tau [N] forces on joints, tau_z [n] on z. A k-jet: a position and its first
   k - 1 derivatives in time. A tape: what a forward function leaves for its backward.

   Generated types, for ROLN_NAME NAME:

       NAME_params      all numbers of a model: scales, time step, range seen in training, weights
       NAME_state       q, qd of all N joints
       NAME_latent      z, zd of the n latent coordinates
       NAME_target      what a controller follows, z, zd, zdd, and how firmly, its gains kp, kd
       NAME_guard       what a guard remembers; in it tau, the torque that may go to the motors
       NAME_equation    M, c, g, d, T, V at a state
       NAME_jacobian    A, B of a step
       NAME_x_work      scratch of NAME_x: arrays with names and shapes, for each function x that takes one
       NAME_work        scratch of a tick, of prediction and of NAME_doubt, a union: NAME_tick(.., &work.tick); one for each thread
                        and interrupt
       NAME_plan        with ROLN_PLAN: a plan, its states, torques and feedback
       NAME_filter      what a filter remembers; in it s, the estimate of z, zd
       NAME_observer    the same of an observer
       NAME_observer_gains  the gains of an observer
       NAME_evidence    what NAME_doubt knows from recordings
       NAME_doubts      what it says
       NAME_outlook     what NAME_doubt_ahead remembers of a roll-out
       NAME_train       scratch of training, of NAME_errors, NAME_evidence_add and NAME_fit_.., a union
       NAME_start       scratch of NAME_init, NAME_init_pod, NAME_chart_add and NAME_chart_solve, a union; with small weights of
                        NAME_quantise
       NAME_gradient    a gradient, the loss and the number of windows behind it
       NAME_optimiser   moments of the optimiser
       NAME_residuals   with ROLN_GN_ROWS: rows and residuals of a step of Gauss-Newton
       NAME_newton      ... its sums, the step and where it ends
       NAME_chart       with ROLN_CHART: sums of NAME_chart_add
       NAME_refinement  ... steps and scratch of NAME_chart_refine
       NAME_words       with small weights: what NAME_write writes

   Generated functions. One control tick:

       NAME_tick        NAME_encode, NAME_control, NAME_lift or NAME_allocate, and NAME_guard_tick in one call
       NAME_encode      q, qd -> z, zd
       NAME_decode      z, zd -> q, qd
       NAME_encode_reference  reference q, qd, qdd -> z, zd, zdd
       NAME_control     PD+ on the model: tau_z = M zdd_ref + C zd_ref + g + d - Kp e - Kd ed
       NAME_gains       gains of joints, Nm/rad and Nms/rad -> those of NAME_control
       NAME_lift        tau_z -> tau = D^T tau_z, or the currents or positions that make it
       NAME_allocate    tau_z -> the few motors that come nearest, and what they cannot make of it
       NAME_guard_tick  lets a torque pass to the motors, clipped to limits, or holds the last one, or stops
       NAME_ahead       with ROLN_DELAY: a latent state at the time at which the torque of this tick acts
       NAME_in_range    is a latent state within what training has seen?
       NAME_fit_limits  the limits of a guard, from recordings of good motion

   Prediction and mechanics:

       NAME_step        z, zd a step of dt seconds ahead under tau: M zdd + c + g + d = J^T tau
       NAME_linear      the same, with its derivatives A, B
       NAME_reduce      tau -> tau_z = J^T tau
       NAME_inverse     z, zd, zdd -> tau_z: inverse dynamics
       NAME_dynamics    M, c, g, d, kinetic and potential energy
       NAME_friction_of with ROLN_FRICTION: its levels c and the velocities v at which it sets in
       NAME_friction_law  ... 2: all numbers of its law
       NAME_actuator_of with ROLN_ACTUATOR current, servo: the gains k, dampings d and offsets o of the joints
       NAME_inertia     y = D^T M D v: the inertia that the joints feel

   Feedback, plans and estimates:

       NAME_lqr         feedback of least cost about a state, from weights of joints and motors
       NAME_lqr_along   the same along a reference, gains that vary with time
       NAME_plan_next   with ROLN_PLAN: the torques ahead that reach a goal at the least cost within the motors' limits
       NAME_plan_follow ... the torque now, with feedback
       NAME_plan_linear ... A, B, c along it, for other solvers
       NAME_plan_tighten  ... how far limits are tightened along it, for what the model does not know
       NAME_filter_tick z, zd from positions alone: a Kalman filter on the model
       NAME_fit_noise   its noise, from recordings
       NAME_observer_tick  the same with gains that were computed beforehand, for small processors
       NAME_fit_observer   these gains, from the noise and recordings

   What the model does not know:

       NAME_doubt       how new a state is, and how far the model may be off there
       NAME_doubt_ahead a step, and how far the state may be off behind it
       NAME_evidence_add   the states of recordings, for both
       NAME_fit_doubt   deviations, from held-out recordings
       NAME_fit_outlook the time over which errors stay alike, from held-out recordings

   Training; all but NAME_errors and NAME_fit_range are of models with full weights:

       NAME_init_pod    scales and weights at the linear optimum (POD) of recorded motion
       NAME_init        random weights
       NAME_ignore      a coordinate becomes ignorable: M, V and R do not depend on it
       NAME_ignores     is it?
       NAME_fit_inertia the unit of inertia, where forces are known
       NAME_variance    of the data of each loss term, to weigh the terms by
       NAME_force_variance   of the force on each latent coordinate, to weigh rows by
       NAME_grad_acc    adds the gradient of the acceleration loss
       NAME_grad        adds the gradient of the loss over windows of several steps
       NAME_update      one step of Riemannian Adam
       NAME_rows        residuals of chosen samples or windows, and their rows, for Gauss-Newton
       NAME_newton_ridge   ... of polynomials: a ridge on their coefficients
       NAME_scale_of    ... the scale of M
       NAME_scale_row   ... and a row that holds it
       NAME_newton_rows Riemannian Gauss-Newton: rows become tangents
       NAME_newton_normal_equations  ... the sums of their products
       NAME_newton_step ... the step, and where it ends
       NAME_newton_accept  ... is it taken? After the last refusal: roln_newton_give_up
       NAME_errors      roll-out errors
       NAME_fit_range   records the range of z, zd that the motion has seen

   A chart in closed form (ROLN_CHART, full weights): NAME_init_pod, or NAME_chart_center, then

       NAME_chart_refine a step to a better encoder, on a few thousand samples
       NAME_chart_add    adds recorded motion, a sample at a time or all, to sums
       NAME_chart_merge  adds the sums of other recordings, or of another machine
       NAME_chart_solve  the decoder that fits them best
       NAME_chart_center coordinates in which the recorded range is -1 .. 1

   Keeping it:

       NAME_check       are the parameters in memory what they were? A few numbers a tick
       NAME_pack        parameters -> bytes
       NAME_unpack      bytes -> parameters
       NAME_params_mismatch  are parameters of another ROLN_SLOPE or ROLN_EIGENVALUE_FLOOR?
       NAME_write       parameters -> C text for flash
       NAME_quantise    with small weights: bytes of the full model -> parameters

   Constants: NAME_N, NAME_n joints and latent coordinates; NAME_force_size numbers of a force: N, or inputs; NAME_theta_size
   trained parameters; NAME_numbers numbers of NAME_params; NAME_packed_size bytes of NAME_pack (NAME_full_packed_size: of the
   model with full weights); NAME_horizon; NAME_steps, NAME_motors of a plan. For the kernels: NAME_model; for an optimiser of
   your own: NAME_table, NAME_blocks. ROLN_CHARTED: 1 if the model included last has a chart, else 0.

   Functions keep nothing in their scratch. A main loop, a task and an interrupt each have scratch of their own: an interrupt that
   calls with the scratch of the code that it interrupts leaves wrong numbers there, with ROLN_OK.

   Statuses of all that evaluates the networks: ROLN_E_SHAPE, the parameters are of another ROLN_SLOPE or ROLN_EIGENVALUE_FLOOR, or
   were never set; ROLN_E_NOT_FINITE; ROLN_E_RANGE, eigenvalues of the mass matrix beyond e^+-40 or too far apart (roln_exp_range);
   ROLN_E_NOT_SPD, a base point or a mass matrix that is not positive definite to working precision; ROLN_E_NO_CONVERGENCE, of the
   eigensolver or of a midpoint step that is too long. A function that fails leaves its outputs untouched. Exceptions say so.

   In this file NAME_x is written ROLN_(x). ROLNI_(x), NAME_i_x, is an inner function of a model. Both call the kernels roln_ae_..,
   roln_lnn_.. of the headers below it, which get sizes as arguments.

   Sections. Once, functions that know no model:

   1 model and units           sizes of a model, and the units that its networks see
   2 guard                     motors, limits, faults
   3 Riccati equations         feedback of least cost for a linear system: by doubling, and step by step backward
   4 optimal control           of a linear system within limits: interior points on a Riccati recursion
   5 feedback, estimates and plans  their settings and states
   6 windows, losses and errors     recorded motion, sums over it
   7 packed parameters         bytes, checksums, C text for flash
   8 from a config to sizes    macros of the preprocessor

   For every ROLN_NAME, the functions listed above. In firmware:

   9 sizes and types of a model
   10 a control tick           in the order in which a measurement meets it: encode, control, lift or allocate, guard
   11 prediction and mechanics a step, its derivatives, inverse dynamics, the terms of the equation of motion
   12 feedback and estimates   LQR, a Kalman filter on the model, doubt
   13 plans                    model predictive control
   14 errors of a model        roll-outs against recordings
   15 range, limits and noise from recordings

   Learning:

   16 a training sample        in the order in which it meets the gradient: gather, encode, roll out, decode, compare, back
   17 scales and first weights
   18 a chart in closed form

   Keeping:

   19 keeping a model          bytes, checksums, C text, small weights
   20 scratch of a program     unions of the scratch above

   Angles in q, any consistent units; z has none, zd is 1/s, M is J s^2, forces on z and energies are J. With ROLN_ANGLES z is q
   itself (scale.q = 1); sliders beside angles in a unit in which they move by about one, which ROLN_SCALE each finds by itself.
   Of an angle, z and q may be on any turn, up to 2^20 rad from 0. Beyond, a function that needs sines or turns says
   ROLN_E_NOT_FINITE, as it does where two that it compares are farther apart: the networks see its cosine and sine, differences are
   those of the shorter way, within (-pi, pi], and its range is an arc, or all of the circle if the recordings went round. NAME_step
   and NAME_linear keep its turn as far as two turns, 4 pi, from 0, and bring it within (-pi, pi] first where it is farther out:
   subtract angles by roln_wrap. */

#ifndef ROLN_H
#define ROLN_H

#include "roln_ae.h"
#include "roln_lnn.h"
#include "roln_riem.h"

/* ---- 1 model and units ----------------------------------------------------------------------- */

/* ROLN_ACTUATOR: the input of a joint is its torque, a current, or the position that a servo follows. */
enum { ROLN_TORQUE = 0, ROLN_CURRENT = 1, ROLN_SERVO = 2 };

/* Everything about a model but its numbers; constant, generated by the shell. */
typedef struct {
    roln_ae ae;
    roln_lnn lnn;
    int scheme; /* ROLN_EULER, ROLN_RK4, ROLN_MIDPOINT, ROLN_LEAPFROG */
    int inputs; /* 0: models get the force tau [N]; else u [inputs] with a learned constant input map, tau = B u */
    int own;    /* 1: each joint has a unit of its own, NAME_params.each */
    int actuator; /* ROLN_TORQUE, ROLN_CURRENT, ROLN_SERVO */
} roln_model;

/* Learned numbers of the actuator of a joint: log k, o, log d. */
#define ROLNI_ACTUATOR_NUMBERS(kind) ((kind) > 0 ? (kind) + 1 : 0)

/* Number of parameters theta: of the autoencoder, the Lagrangian network and, with inputs, B [N][inputs], or the actuators. */
ROLN_FN int roln_params(const roln_model *md)
{
    return roln_ae_params(&md->ae) + roln_lnn_params(&md->lnn) +
           md->ae.size[0] * (md->inputs + ROLNI_ACTUATOR_NUMBERS(md->actuator));
}

/* Numbers of a force as the model gets it: N, or inputs. */
ROLN_FN int roln_force_size(const roln_model *md)
{
    return md->inputs > 0 ? md->inputs : md->ae.size[0];
}

/* The networks see x = q / scale.q and time / scale.t, so that users need not scale their data; where joints have units of their
   own, x_j = q_j / (scale.q each_j). Their mass matrix is M / scale.m, their energies E scale.t^2 / scale.m. */
typedef struct {
    roln_real q, t, m;
} roln_scale;

/* The law of dry friction of a coordinate with ROLN_FRICTION 2 (roln_lnn.h, rolni_law), for a velocity zd and a gravity term g:
       d = (c (1 + a y) + s (1 - Y^2) + l |g|) y,   y = tanh(zd / v),  Y = tanh(zd / w) */
typedef struct {
    roln_real c, v; /* level, and the velocity at which it sets in */
    roln_real s, w; /* excess at rest (Stribeck), and the velocity over which it falls */
    roln_real l, a; /* part of the static load; asymmetry: the level is c (1 + a) forward and c (1 - a) backward */
} roln_friction;

/* True if every angle has unit 1 in each; each NULL: every unit is 1. */
ROLN_FN int rolni_each_turns(const roln_model *md, const roln_real *each)
{
    int i, turns = 1;
    for (i = 0; each && i < md->lnn.n; i++)
        turns &= !roln_lnn_angle(&md->lnn, i) || each[i] == 1;
    return turns;
}

/* x_ij /= each_j, from joints to networks, and x_ij *= each_j, of x [rows][N]; each NULL: nothing. */
ROLNI_INLINE void rolni_divide_each(int rows, int N, const roln_real *each, roln_real *x)
{
    int i, j;
    for (i = 0; each && i < rows; i++)
        for (j = 0; j < N; j++)
            x[i * N + j] /= each[j];
}

ROLNI_INLINE void rolni_multiply_each(int rows, int N, const roln_real *each, roln_real *x)
{
    int i, j;
    for (i = 0; each && i < rows; i++)
        for (j = 0; j < N; j++)
            x[i * N + j] *= each[j];
}

/* A force, and a velocity, of one unit in the units of the networks. */
ROLN_FN roln_real rolni_force_unit(const roln_scale *sc)
{
    return sc->q * sc->t * sc->t / sc->m;
}

ROLN_FN roln_real rolni_velocity_unit(const roln_scale *sc)
{
    return sc->t / sc->q;
}

/* Angles of z [nb][n] that are more than two turns from 0 come back within (-pi, pi]: farther out a step of a millisecond would be
   lost in their rounding. NaN beyond 2^20. */
ROLNI_INLINE void rolni_turn_back(const roln_lnn *f, int nb, roln_real *z)
{
    int i;
    for (i = 0; i < nb * f->n; i++)
        if (roln_lnn_angle(f, i % f->n) && ROLN_ABS(z[i]) > 4 * ROLNI_PI) z[i] = roln_wrap(z[i]);
}

/* ---- 2 guard --------------------------------------------------------------------------------- */

/* The energy T + V at a state, and the power zd^T d that is lost there. limits.residual bounds how far they may disagree. */
typedef struct {
    roln_real energy, lost;
} rolni_balance;

/* Positions of motors: tau = B u. */
typedef struct {
    int count;
    const roln_real *B; /* [N][count]; NULL: the map that a model with inputs has learned, count is then its inputs */
    roln_real mu;       /* damping of NAME_allocate; a hundredth of the largest number of J^T B is usual */
} roln_motors;

/* The actuator of a joint, tau = k u + o or k (u - q) - d qd + o. */
typedef struct {
    roln_real k, d, o;
} rolni_actuator;

/* The largest |x_i| of x [n]. */
ROLN_FN roln_real rolni_largest(int n, const roln_real *x)
{
    roln_real top = 0;
    int i;
    for (i = 0; i < n; i++)
        top = ROLN_MAX(top, ROLN_ABS(x[i]));
    return top;
}

/* mu^2 |y| / |x|, at most 1, of x, y [n] of any size; 0 if x is 0, 1 if y is too small for a number. */
ROLN_FN roln_real rolni_allocation_residual(int n, const roln_real *x, const roln_real *y, roln_real mu)
{
    const roln_real tx = rolni_largest(n, x), ty = rolni_largest(n, y);
    roln_real sx = 0, sy = 0;
    int i;
    if (!(tx > 0) || !(mu > 0)) return 0;
    if (!(ty > 0)) return 1;
    for (i = 0; i < n; i++)
        sx += x[i] / tx * (x[i] / tx), sy += y[i] / ty * (y[i] / ty);
    return ROLN_MIN(mu * (ty / tx) * mu * ROLN_SQRT(sy / sx), 1);
}

/* 1 if every pivot of R [n][n], the triangle of count rows, is above rounding errors. */
ROLN_FN int rolni_spans(int n, int count, const roln_real *R)
{
    const roln_real least = 8 * ROLNI_AS(roln_real, n + count) * ROLN_EPS;
    int i, k;
    for (i = 0; i < n; i++) {
        roln_real top = 0;
        for (k = 0; k <= i; k++)
            top = ROLN_MAX(top, ROLN_ABS(R[k * n + i]));
        if (!(ROLN_ABS(R[i * (n + 1)]) > least * top)) return 0;
    }
    return 1;
}

/* y [n] becomes R^-1 R^-T y, R [n][n] upper triangular. */
ROLN_FN void rolni_solve_square(int n, const roln_real *R, roln_real *y)
{
    int i, k;
    rolni_solve_upper_t(n, 1, R, y);
    for (i = n - 1; i >= 0; i--) {
        for (k = i + 1; k < n; k++)
            y[i] -= R[i * n + k] * y[k];
        y[i] /= R[i * (n + 1)];
    }
}

/* What stands between a model and a motor. Bits of a fault word, unsigned: they may be or-ed with bits of a filter and with yours.
   They are no enumerators, because C++26 refuses to or those of two enumerations. */
#define ROLN_FAULT_INPUT 1u       /* q, qd, dt, a limit or the motors are not usable numbers. */
#define ROLN_FAULT_STATUS 2u      /* A function on the way returned a status other than ROLN_OK. */
#define ROLN_FAULT_OUTPUT 4u      /* A torque is NaN or infinite. */
#define ROLN_FAULT_LIMIT 8u       /* A torque is beyond a limit of torque or rate, and limits.strict is 1. */
#define ROLN_FAULT_RANGE 16u      /* z or zd is outside the range of the training data, widened by limits.margin, or
                                     their novelty is beyond limits.novelty. */
#define ROLN_FAULT_ENERGY 32u     /* |dE/dt - zd^T (J^T tau - d)| is beyond limits.residual. */
#define ROLN_FAULT_EXPIRED 64u    /* More than limits.hold bad ticks or alarms in a row: safe torques until guard.g is zeroed. */
#define ROLN_FAULT_MANIFOLD 128u  /* q or qd is farther than q_tolerance or qd_tolerance from what the model can represent. */
#define ROLN_CLIPPED 256u         /* A torque was clipped to a limit of torque or rate. This is no fault. */

typedef struct {
    roln_real dt;     /* time from tick to tick, s */
    roln_real margin; /* of the range: of z as a part of its width, of zd as a part of the largest */
    roln_real residual; /* largest residual of the energy rate, W (in the unit of the model's energy, if its forces had none); 0: it
                           is not checked */
    roln_real tau;    /* largest torque of each joint (or input) */
    int hold;         /* bad ticks in a row for which the last torque is held; with false_alarms alarms in a row, too */
    roln_real q_tolerance;  /* largest |q - phi(z)| of a joint, what z does not see of q; 0: no check */
    roln_real qd_tolerance; /* largest |qd - J zd| of a joint; 0: no check */
    /* what follows may be left out */
    int residual_window; /* ticks over which the energy residual is averaged before it is compared with `residual`; 0, 1: each by
                            itself; more than 1 / (64 ROLN_EPS), 131072 as float, count as that: a longer mean would stand still in
                            its rounding */
    int strict;       /* 1: a torque beyond a limit of torque or rate is a fault; 0: it is clipped */
    roln_real rate;   /* largest change of each joint's torque in a second; 0: no bound */
    const roln_real *tau_each, *rate_each; /* [torques] in place of tau, of rate; NULL: these */
    const roln_real *safe; /* [torques] once the guard has expired, read in every tick; NULL: 0 */
    const roln_motors *motors; /* where they act, and torques are theirs; NULL: at each joint, or the learned inputs */
    const roln_real *evidence; /* NAME_evidence.L of the states that are known; NULL: novelty is not checked */
    roln_real novelty;         /* largest novelty of a state (NAME_doubt) */
    roln_real false_alarms; /* part of the windows of good motion, below 1, that may be beyond `residual`, which the guard then lets
                               follow them (rolni_alarm); it needs a residual. 0: `residual` is a fixed limit of the running mean */
} roln_limits; /* torques: the count of motors with a B, else NAME_force_size */

/* Most numbers of a running mean. Of one more, as large as the mean, it keeps six bits; a longer mean would stand still. */
#define ROLNI_AVERAGED (1 / (64 * ROLN_EPS))

/* How new a state is to a model. t [m] are the terms of the state: 1, its variables and products of their polynomials. With A the
   mean of t t^T over the states that were seen,
       novelty = t^T A^-1 t / m,
   the reciprocal of their Christoffel function (Lasserre and Pauwels 2016). Its mean over these states is 1, or less where terms
   depend on each other, as those of the cosine and the sine of an angle do. It is large where a polynomial that is small at all of
   them can be large: outside of them and in holes between them. */

/* The novelty of t, which is spent, from the rows of the lower triangle L [ROLN_TRI(m)], A = L L^T. It is NaN or infinite if a term
   is. */
ROLN_FN roln_real rolni_novelty(int m, const roln_real *L, roln_real *t)
{
    int i;
    for (i = 0; i < m; L += ++i)
        t[i] = roln_finite(L[i]) ? (t[i] - roln_dot(i, L, t)) / L[i] : L[i] - L[i]; /* infinite: NaN */
    return roln_dot(m, t, t) / ROLNI_AS(roln_real, m);
}

/* One more state: A becomes A + (t t^T - A) / count, by plane rotations of L. t is spent. The matrix 1 that A begins with is worth
   a state for ever: no diagonal of L falls below the root of 1 / ROLNI_AVERAGED. */
ROLN_FN void rolni_novelty_add(int m, roln_real count, roln_real *L, roln_real *t)
{
    const roln_real part = 1 / count, old = ROLN_SQRT(1 - part), new_part = ROLN_SQRT(part), least = ROLN_SQRT(1 / ROLNI_AVERAGED);
    int i, k;
    for (i = 0; i < ROLN_TRI(m); i++)
        L[i] *= old;
    for (i = 0; i < m; i++)
        t[i] *= new_part;
    for (k = 0; k < m; k++) {
        roln_real *at = L + ROLN_TRI(k) + k;
        const roln_real r = ROLN_SQRT(*at * *at + t[k] * t[k]), c = *at / r, s = t[k] / r;
        *at = ROLN_MAX(r, least);
        for (i = k + 1; i < m; i++) {
            at += i;
            {
                const roln_real a = *at;
                *at = c * a + s * t[i];
                t[i] = c * t[i] - s * a;
            }
        }
    }
}

/* State of a guard, beside the torque of the last tick. Zero-initialised: a fresh start. */
typedef struct {
    uint32_t faults; /* sticky: the faults of all ticks so far */
    int bad;         /* bad ticks in a row; -1: expired, as faults says, too */
    int valid;       /* 1: energy and power are those of the last tick */
    roln_real energy, power;
    roln_real residual; /* of the energy rate, W, averaged over limits.residual_window */
    roln_real allocation_residual; /* of the last tau_z that motors had to make, the part that they could not (NAME_allocate) */
    /* with limits.false_alarms */
    roln_real sum;    /* of the residuals of this window */
    int ticks;        /* of this window */
    roln_real raised; /* excess of the alarms over their expected number, at the last alarm */
    uint32_t since;   /* windows since then */
    uint32_t alarms;  /* in a row, up to then; 0: there was none */
} roln_guard;

/* Nonzero if the limits of nu torques make sense: finite, none negative, dt positive. */
ROLN_FN int rolni_limits_valid(const roln_limits *limits, int nu)
{
    const roln_real bound[9] = {limits->dt,           limits->margin, limits->residual, limits->tau,         limits->q_tolerance,
                                limits->qd_tolerance, limits->rate,   limits->novelty,  limits->false_alarms};
    const roln_real *const each[2] = {limits->tau_each, limits->rate_each};
    int i, k, valid = roln_all_finite(9, bound) && limits->dt > 0 && limits->hold >= 0 && limits->residual_window >= 0;
    for (i = 1; i < 9; i++)
        valid &= bound[i] >= 0;
    valid &= limits->false_alarms < 1 && (limits->false_alarms <= 0 || limits->residual > 0);
    for (k = 0; k < 2; k++)
        for (i = 0; each[k] && i < nu; i++)
            valid &= roln_finite(each[k][i]) && each[k][i] >= 0;
    return valid;
}

/* Nonzero if it is known how many motors there are: they are learned, or at most N at a model's joints. A servo belongs to a joint:
   other motors do not fit. */
ROLN_FN int rolni_motors_counted(const roln_model *md, const roln_motors *motors)
{
    if (!motors) return 1;
    if (md->actuator == ROLN_SERVO) return 0;
    if ((motors->B != NULL) != (md->inputs == 0)) return 0;
    return !motors->B || (motors->count >= 1 && motors->count <= md->ae.size[0]);
}

/* Nonzero if the motors are those of a model. */
ROLN_FN int rolni_motors_valid(const roln_model *md, const roln_motors *motors)
{
    return rolni_motors_counted(md, motors) && (!motors || (roln_finite(motors->mu) && motors->mu >= 0));
}

/* Numbers of a torque, of motors that are counted. */
ROLN_FN int rolni_torques(const roln_model *md, const roln_motors *motors)
{
    return motors && motors->B ? motors->count : roln_force_size(md);
}

/* The largest torque of joint i. */
ROLN_FN roln_real rolni_most(const roln_limits *limits, int i)
{
    return limits->tau_each ? limits->tau_each[i] : limits->tau;
}

/* Its largest change in a second; 0: no bound. */
ROLN_FN roln_real rolni_rate(const roln_limits *limits, int i)
{
    return limits->rate_each ? limits->rate_each[i] : limits->rate;
}

/* Nonzero if torques have a limit of their rate. */
ROLN_FN int rolni_rated(const roln_limits *limits)
{
    return limits->rate > 0 || limits->rate_each;
}

/* The torque of joint i after `last`, which is within its limit, that comes nearest to want. */
ROLN_FN roln_real rolni_clip(const roln_limits *limits, int i, roln_real last, roln_real want)
{
    const roln_real top = rolni_most(limits, i), rate = rolni_rate(limits, i);
    roln_real low = -top, high = top;
    if (rate > 0) {
        const roln_real step = rate * limits->dt, down = last - step, up = last + step; /* stored: compared as rounded */
        low = ROLN_MAX(low, down), high = ROLN_MIN(high, up);
    }
    return want < low ? low : want > high ? high : want;
}

/* The torque of the last tick of joint i: it is only trusted within the limit; nothing else may reach a motor. */
ROLN_FN roln_real rolni_last(const roln_limits *limits, int i, roln_real tau)
{
    return roln_finite(tau) && ROLN_ABS(tau) <= rolni_most(limits, i) ? tau : 0;
}

/* The safe torque of joint i. */
ROLN_FN roln_real rolni_safe(const roln_limits *limits, int i)
{
    const roln_real top = rolni_most(limits, i), safe = limits->safe ? limits->safe[i] : 0;
    if (!roln_finite(safe) || !roln_finite(top) || !(top >= 0)) return 0;
    return safe < -top ? -top : safe > top ? top : safe;
}

/* Nonzero if |a - b| <= bound for all n numbers; NaN is not. bound 0: no check. */
ROLN_FN int rolni_all_within(int n, const roln_real *a, const roln_real *b, roln_real bound)
{
    int i, alike = 1;
    for (i = 0; i < n && bound > 0; i++)
        alike &= ROLN_ABS(a[i] - b[i]) <= bound;
    return alike;
}

/* The same of positions, of which some are angles. */
ROLN_FN int rolni_near_turned(const roln_lnn *f, const roln_real *a, const roln_real *b, roln_real bound)
{
    int i, alike = 1;
    for (i = 0; i < f->n && bound > 0; i++)
        alike &= ROLN_ABS(a[i] - roln_lnn_near(f, i, a[i], b[i])) <= bound;
    return alike;
}

/* Nonzero if a limit asks for the decoded state. */
ROLN_FN int rolni_limits_decode(const roln_limits *limits)
{
    return limits->q_tolerance > 0 || limits->qd_tolerance > 0 || limits->residual > 0;
}

/* f of the limit of the mean residual of a window, at least `low`. With limits->false_alarms = a the limit is
       residual e^(f / 8),   f += 1 - a after a window that is beyond it, f -= a after one that is not,   -1 <= f <= 16
   (adaptive conformal inference; Gibbs and Candes 2021). After W windows the alarms are at most a W + 17, whatever the residuals
   were, as long as f is below 16; with float rounding adds one in a million. A machine that rests or moves slowly for a long time
   has small residuals; the limit does not follow these down, and one alarm brings it back to `residual`. f = raised - a since, so
   that small a are not lost in rounding. */
ROLN_FN roln_real rolni_raised(const roln_limits *limits, const roln_guard *g, roln_real low)
{
    const roln_real f = g->raised - limits->false_alarms * ROLNI_AS(roln_real, g->since);
    return !roln_finite(f) ? 0 : f < low ? low : f > 16 ? 16 : f;
}

/* How many of W windows are to be at the limit or beyond: the integer a (W + 1), or that below. 1/41 of 41, rounded, is 1. */
ROLN_FN uint32_t rolni_tail_rank(roln_real a, uint32_t windows)
{
    return ROLNI_AS(uint32_t, a * ROLNI_AS(roln_real, windows + 1) * (1 + 4 * ROLN_EPS));
}

/* The limit of the mean residual of a window that ends now, W. */
ROLN_FN roln_real rolni_residual_limit(const roln_limits *limits, const roln_guard *g)
{
    return limits->residual * roln_exp(rolni_raised(limits, g, -1) / 8);
}

/* Ticks over which residuals are averaged. */
ROLN_FN roln_real rolni_window(const roln_limits *limits)
{
    return ROLN_MAX(1, ROLN_MIN(ROLNI_AS(roln_real, limits->residual_window), ROLNI_AVERAGED));
}

/* The residual r of one more tick. Nonzero if it is the last of a window whose mean is beyond the limit, which then follows. An
   alarm is one in a row in the window behind the last one, and later if it is not more than 1 / (16 a) windows behind it. Of all
   false alarms, if they are independent and a <= 1 / 16, at most one in 16^k is followed by k more in a row. */
ROLN_FN int rolni_alarm(const roln_limits *limits, roln_real r, roln_guard *g)
{
    const roln_real a = limits->false_alarms, ticks = ROLNI_AS(roln_real, ROLN_MAX(g->ticks, 0)) + 1;
    const int last = g->ticks < 0 || ticks >= rolni_window(limits);
    int alarm;
    g->sum += r, g->ticks = last ? 0 : g->ticks + 1;
    if (!last) return 0;
    r = g->sum / ticks; /* more than residual_window, if that has become smaller */
    g->sum = 0, g->residual = roln_finite(r) ? r : 0;
    alarm = !(roln_finite(r) && ROLN_ABS(r) <= rolni_residual_limit(limits, g));
    g->since += g->since < UINT32_MAX;
    if (!alarm) return 0;
    g->alarms = g->since > 1 && 16 * a * ROLNI_AS(roln_real, g->since) > 1 ? 1 : g->alarms + (g->alarms < UINT32_MAX);
    g->raised = ROLN_MIN(rolni_raised(limits, g, -1 - a) + 1, 16), g->since = 0; /* since has this window, too */
    return 1;
}

/* The energy residual of a tick, W: the rate at which energy was gained since the last one, beyond the mean power of its ends;
   before: the power at its end, under the torque of the last tick. Its mean over limits->residual_window is kept in g. Nonzero if
   that is too large. */
ROLN_FN int rolni_unbalanced(const roln_limits *limits, const rolni_balance *b, roln_real before, roln_guard *g)
{
    const roln_real window = rolni_window(limits);
    roln_real r = (b->energy - g->energy) / limits->dt - (before + g->power) / 2;
    if (limits->false_alarms > 0) return rolni_alarm(limits, r, g);
    if (window > 1) r = g->residual + (r - g->residual) / window;
    g->residual = roln_finite(r) ? r : 0;
    return !(ROLN_ABS(r) <= limits->residual);
}

/* Limits where the number of motors is unknown: the arrays cannot be read, and in place of tau_each a torque has to be 0. */
ROLN_FN roln_limits rolni_limits_uncounted(const roln_limits *limits)
{
    roln_limits l = *limits;
    if (l.tau_each) l.tau = 0;
    l.tau_each = l.rate_each = l.safe = NULL, l.motors = NULL;
    return l;
}

/* ---- 3 Riccati equations --------------------------------------------------------------------- */

/* x+ = A x + B u at the least cost sum x^T Q x + u^T R u. What is left of the cost from x on is x^T X x, and u = -K x.
   Q = D^T D and X = C^T C are kept as factors, R is diagonal: X is symmetric and positive semi-definite by construction, and
   factors need half the digits that X does. D = diag(roots of the weights), or what a measurement y = D x makes of x. */

/* Brings that of the columns k .. m-1 of X [rows][n] to place k which is the largest in the rows from k on, in units of roots of r;
   order [m]: which input a column belongs to. */
ROLN_FN void rolni_pivot(int rows, int n, int m, int k, const roln_real *r, roln_real *X, roln_real *order)
{
    roln_real top = -1, x;
    int best = k, i, j;
    for (j = k; j < m; j++) {
        roln_real most = 0;
        for (i = k; i < rows; i++)
            most = ROLN_MAX(most, ROLN_ABS(X[i * n + j]));
        most /= ROLN_SQRT(r[ROLNI_AS(int, order[j])]);
        if (most > top) top = most, best = j;
    }
    for (i = 0; i < rows; i++)
        x = X[i * n + k], X[i * n + k] = X[i * n + best], X[i * n + best] = x;
    x = order[k], order[k] = order[best], order[best] = x;
}

/* One step of the Riccati recursion, backward in time: with X = C^T C behind the step,
       K = (R + B^T X B)^-1 B^T X A     X in front of it = Q + A^T X A - K^T (R + B^T X B) K
   A [n][n], B [n][m], D [n][n], r [m] the diagonal of R, above 0, in; C [n][n], any factor in, upper triangular out; K [m][n] out;
   both as they were unless ROLN_OK. Nothing is squared: one triangle
       [R^1/2 0; C B  C A; 0 D] = U [S  S K; 0 C]
   whose next input is always the one that the most is left of, in units of r_j^1/2. K is then off by a few times, with several
   motors rarely by hundreds of times, what rounding errors of r, D, C B and C A do to it, whatever the units of states and
   inputs, and for any ratio of r to B^T X B (test_riccati.c: test_rows).
   ROLN_E_NOT_SPD: r; ROLN_E_NOT_FINITE. (m + 2 n) (m + n)^2 multiply-adds, twice. work [ROLN_RICCATI_WORK]. */
#define ROLN_RICCATI_MEM(X, n, m) X(Y, (n) * ((n) + (m))) X(S, ((m) + 2 * (n)) * ((m) + (n))) X(order, m)
#define ROLN_RICCATI_WORK(n, m) (0 ROLN_RICCATI_MEM(ROLNI_SIZE, n, m) + ROLN_QR_R_WORK((m) + 2 * (n), (m) + (n)))
ROLN_FN roln_status roln_riccati(int n, int m, const roln_real *A, const roln_real *B, const roln_real *D, const roln_real *r,
                                 roln_real *C, roln_real *K, roln_real *work)
{
    const int side = m + n;
    ROLN_RICCATI_MEM(ROLNI_CARVE, n, m)
    int i, j, k;
    for (i = 0; i < m; i++)
        if (!(r[i] > 0)) return roln_finite(r[i]) ? ROLN_E_NOT_SPD : ROLN_E_NOT_FINITE;
    rolni_zero((m + 2 * n) * side, S);
    roln_mm(n, n, m, C, B, Y);
    roln_mm(n, n, n, C, A, Y + n * m);
    for (j = 0; j < m; j++) {
        order[j] = ROLNI_AS(roln_real, j);
        S[j * side + j] = ROLN_SQRT(r[j]);
        for (i = 0; i < n; i++)
            S[(m + i) * side + j] = Y[i * m + j];
    }
    for (i = 0; i < n; i++) {
        rolni_copy(n, Y + n * m + i * n, S + (m + i) * side + m);
        rolni_copy(n, D + i * n, S + (m + n + i) * side + m);
    }
    for (k = 0; k < side; k++) {
        if (k < m) rolni_pivot(m + n, side, m, k, r, S, order);
        rolni_reflect(m + 2 * n, side, k, S, work);
    }
    for (i = m - 1; i >= 0; i--) /* K = S^-1 (S K), in Y */
        for (j = 0; j < n; j++) {
            roln_real x = S[i * side + m + j];
            for (k = i + 1; k < m; k++)
                x -= S[i * side + k] * Y[k * n + j];
            Y[i * n + j] = x / S[i * side + i];
        }
    if (!roln_all_finite(m * n, Y) || !roln_all_finite(side * side, S)) return ROLN_E_NOT_FINITE;
    for (j = 0; j < m; j++)
        rolni_copy(n, Y + j * n, K + ROLNI_AS(int, order[j]) * n);
    for (i = 0; i < n; i++)
        rolni_copy(n, S + (m + i) * side + m, C + i * n);
    return ROLN_OK;
}

/* S [2n][n] becomes the triangle of [X Y^T; I], X, Y [n][n]. work [ROLN_QR_R_WORK(2n, n)]. */
ROLN_FN void rolni_border(int n, const roln_real *X, const roln_real *Y, roln_real *S, roln_real *work)
{
    int i;
    roln_mm_bt(n, n, n, X, Y, S);
    rolni_zero(n * n, S + n * n);
    for (i = 0; i < n; i++)
        S[(n + i) * n + i] = 1;
    roln_qr_r(2 * n, n, S, work);
}

/* A step of the equation X = A^T X (I + G X)^-1 A + H, G = L^T L, H = D^T D, with X = H: what is left, X - H, solves the same
   equation with
       A' = (I + G H)^-1 A     G' = (I + G H)^-1 G     H' = A^T H (I + G H)^-1 A
   A' is the loop that is closed by a feedback that knows H. With F = D L^T and the triangles R1 of [F; I], R2 of [F^T; I]
       L' = R1^-T L     D' = R2^-T D A     A' = A - L'^T (R1^-T F^T) D A
   A, L, D [n][n] in and out. work [ROLNI_SHIFT_WORK]. */
#define ROLNI_SHIFT_MEM(X, n) X(E, (n) * (n)) X(V, 2 * (n) * (n)) X(W, (n) * (n)) X(S, 2 * (n) * (n))
#define ROLNI_SHIFT_WORK(n) (0 ROLNI_SHIFT_MEM(ROLNI_SIZE, n) + ROLN_QR_R_WORK(2 * (n), n))
ROLN_FN void rolni_shift(int n, roln_real *A, roln_real *L, roln_real *D, roln_real *work)
{
    ROLNI_SHIFT_MEM(ROLNI_CARVE, n)
    int i;
    roln_mm(n, n, n, D, A, E);
    roln_mm_bt(n, n, n, L, D, V);
    rolni_border(n, D, L, S, work);
    rolni_solve_upper_t(n, n, S, V);
    roln_mm(n, n, n, V, E, W);
    for (i = 0; i < n * n; i++)
        W[i] = -W[i];
    rolni_border(n, L, D, V, work);
    rolni_solve_upper_t(n, n, V, E);
    rolni_solve_upper_t(n, n, S, L);
    roln_mm_at(n, n, n, L, W, A);
    rolni_copy(n * n, E, D);
}

/* X [n][n] becomes the triangle of [X; Y]. S [2n][n]. work [ROLN_QR_R_WORK(2n, n)]. */
ROLN_FN void rolni_stack(int n, const roln_real *Y, roln_real *X, roln_real *S, roln_real *work)
{
    rolni_copy(n * n, X, S);
    rolni_copy(n * n, Y, S + n * n);
    roln_qr_r(2 * n, n, S, work);
    rolni_copy(n * n, S, X);
}

/* 1 if x^T D^T D x is at most `part` of x^T C^T C x for every x. C [n][n] is upper triangular; D [n][n] becomes D C^-1. The answer
   does not depend on units or directions of states: a cheap subsystem counts as much as a dear one (test_riccati.c:
   test_decoupled). A pivot of C that is 0 is a direction without cost; D must have none there. n^3 / 2 multiply-adds. */
ROLN_FN int rolni_is_part(int n, const roln_real *C, roln_real part, roln_real *D)
{
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++) {
            roln_real x = D[i * n + j];
            for (k = 0; k < j; k++)
                x -= D[i * n + k] * C[k * n + j];
            if (ROLN_ABS(x) > 0 && !(ROLN_ABS(C[j * (n + 1)]) > 0)) return 0;
            D[i * n + j] = ROLN_ABS(x) > 0 ? x / C[j * (n + 1)] : 0;
        }
    return roln_dot(n * n, D, D) <= part;
}

/* The factor C of roln_dare, but for the last step. A step k shifts, C^T C += D^T D, and doubles: with (Ab, Lb, Db) that of another
   shift, which is only looked at, the equation of two steps in one is
       A Ab     G + A Lb^T Lb A^T     H + Db^T Db
   work [ROLNI_DOUBLE_WORK]. */
#define ROLNI_DOUBLINGS 60
#define ROLNI_DOUBLE_MEM(X, n, m) \
    X(Aa, (n) * (n)) X(La, (n) * (n)) X(Da, (n) * (n)) X(Ab, (n) * (n)) X(Lb, (n) * (n)) X(Db, (n) * (n)) \
    X(S, (n) * ROLN_MAX(2 * (n), m))
#define ROLNI_DOUBLE_WORK(n, m) \
    (0 ROLNI_DOUBLE_MEM(ROLNI_SIZE, n, m) + ROLN_MAX(ROLNI_SHIFT_WORK(n), ROLN_QR_R_WORK(m, n)))
ROLN_FN roln_status rolni_double(int n, int m, const roln_real *A, const roln_real *B, const roln_real *D, const roln_real *r,
                                 roln_real *C, roln_real *work)
{
    const int nn = n * n;
    ROLNI_DOUBLE_MEM(ROLNI_CARVE, n, m)
    int i, j, k;
    rolni_zero(nn, C);
    rolni_zero(nn, S);
    for (j = 0; j < m; j++) /* G = B R^-1 B^T */
        for (i = 0; i < n; i++)
            S[j * n + i] = B[i * m + j] / ROLN_SQRT(r[j]);
    if (m > n) roln_qr_r(m, n, S, work);
    rolni_copy(nn, S, La);
    rolni_copy(nn, A, Aa);
    rolni_copy(nn, D, Da);
    for (k = 0; k < ROLNI_DOUBLINGS; k++) {
        rolni_stack(n, Da, C, S, work);
        rolni_shift(n, Aa, La, Da, work);
        if (!roln_all_finite(3 * nn, Aa) || !roln_finite(roln_dot(nn, C, C))) return ROLN_E_NO_CONVERGENCE;
        rolni_copy(3 * nn, Aa, Ab); /* Aa, La, Da */
        if (4 * roln_dot(nn, Aa, Aa) <= 1 && rolni_is_part(n, C, ROLN_EPS / 8, Db)) return ROLN_OK;
        rolni_copy(nn, Da, Db);
        rolni_shift(n, Ab, Lb, Db, work);
        roln_mm_bt(n, n, n, Lb, Aa, S);
        rolni_copy(nn, S, Lb);
        rolni_stack(n, Lb, La, S, work);
        rolni_stack(n, Db, Da, S, work);
        roln_mm(n, n, n, Aa, Ab, S);
        rolni_copy(nn, S, Aa);
    }
    return ROLN_E_NO_CONVERGENCE;
}

/* The cost x^T C^T C x of the feedback u = -K x for ever: C^T C = sum_k (A - B K)^k^T (D^T D + K^T R K) (A - B K)^k, whose sum is
   doubled with every step (Smith 1968), in factors. steps: how many there are in it. ROLN_E_NO_CONVERGENCE: K does not stabilise
   what costs. work [ROLNI_POLICY_WORK]. */
#define ROLNI_POLICY_MEM(X, n, m) X(Aa, (n) * (n)) X(E, (n) * (n)) X(S, ((n) + ROLN_MAX(n, m)) * (n))
#define ROLNI_POLICY_WORK(n, m) \
    (0 ROLNI_POLICY_MEM(ROLNI_SIZE, n, m) + ROLN_QR_R_WORK((n) + ROLN_MAX(n, m), n))
ROLN_FN roln_status rolni_policy(int n, int m, const roln_real *A, const roln_real *B, const roln_real *D, const roln_real *r,
                                 const roln_real *K, roln_real *C, roln_real *steps, roln_real *work)
{
    const int nn = n * n;
    ROLNI_POLICY_MEM(ROLNI_CARVE, n, m)
    int i, j, k;
    roln_mm(n, m, n, B, K, Aa);
    for (i = 0; i < nn; i++)
        Aa[i] = A[i] - Aa[i];
    rolni_copy(nn, D, S);
    for (j = 0; j < m; j++)
        for (i = 0; i < n; i++)
            S[nn + j * n + i] = ROLN_SQRT(r[j]) * K[j * n + i];
    roln_qr_r(n + m, n, S, work);
    rolni_copy(nn, S, C);
    *steps = 1;
    for (k = 0; k < ROLNI_DOUBLINGS; k++, *steps *= 2) {
        roln_mm(n, n, n, C, Aa, E);
        if (!roln_all_finite(nn, E) || !roln_finite(roln_dot(nn, C, C))) return ROLN_E_NO_CONVERGENCE;
        rolni_copy(nn, E, S);
        if (rolni_is_part(n, C, ROLN_EPS / 8, S)) return ROLN_OK;
        rolni_stack(n, E, C, S, work);
        roln_mm(n, n, n, Aa, Aa, E);
        rolni_copy(nn, E, Aa);
    }
    return ROLN_E_NO_CONVERGENCE;
}

/* How far a row of K [m][n] is from that of K0 [m][n] at most, as a part of the row. The square of a row is the sum of
   r_j K_ji^2 / X_ii, X = C^T C, which has no unit. A row may move by twice the root of eps of the other rows for nothing: rounding
   does that where several motors can do the same. Any row may move by 32 eps for nothing (test_riccati.c: test_moves).
   size [2m] is written. */
ROLN_FN roln_real rolni_moved(int n, int m, const roln_real *r, const roln_real *C, const roln_real *K, const roln_real *K0,
                              roln_real *size)
{
    roln_real all = 256 * ROLN_EPS, most = 0;
    int i, j, k;
    rolni_zero(2 * m, size);
    for (i = 0; i < n; i++) {
        roln_real top = 0;
        for (k = 0; k <= i; k++)
            top = ROLN_MAX(top, ROLN_ABS(C[k * n + i]));
        for (j = 0; j < m && top > 0; j++) {
            const roln_real one = ROLN_SQRT(r[j]) / top, x = one * K[j * n + i], d = one * (K[j * n + i] - K0[j * n + i]);
            size[j] += x * x, size[m + j] += d * d, all += x * x;
        }
    }
    for (j = 0; j < m; j++) {
        const roln_real off = size[m + j] - 4 * ROLN_EPS * (all - size[j]);
        if (!(off <= size[j])) return 1;
        most = off > most * most * size[j] ? ROLN_SQRT(off / size[j]) : most;
    }
    return most;
}

/* `count` steps of roln_riccati: C [n][n] in and out, K [m][n] that of the last one. work [ROLN_RICCATI_WORK]. */
ROLN_FN roln_status rolni_riccatis(int count, int n, int m, const roln_real *A, const roln_real *B, const roln_real *D,
                                   const roln_real *r, roln_real *C, roln_real *K, roln_real *work)
{
    roln_status st = ROLN_OK;
    for (; count > 0 && st == ROLN_OK; count--)
        st = roln_riccati(n, m, A, B, D, r, C, K, work);
    return st;
}

/* Policies from the one of K [m][n] on, whose cost is in C [n][n]. Steps of roln_riccati after each take its rounding out of what
   is fast. 1 with C and K of the last one if they come to rest: each moves K by at most half of what the one before did, until a
   move is below the root of eps. *first: the first move. work [ROLNI_POLICIES_WORK]. */
#define ROLNI_POLICIES_MEM(X, n, m) X(before, (m) * (n))
#define ROLNI_POLICIES_WORK(n, m) \
    (0 ROLNI_POLICIES_MEM(ROLNI_SIZE, n, m) + ROLN_MAX(ROLNI_POLICY_WORK(n, m), ROLN_RICCATI_WORK(n, m)))
ROLN_FN int rolni_policies(int n, int m, const roln_real *A, const roln_real *B, const roln_real *D, const roln_real *r,
                           roln_real *C, roln_real *K, roln_real *first, roln_real *work)
{
    ROLNI_POLICIES_MEM(ROLNI_CARVE, n, m)
    roln_real steps, last = 2, moved;
    for (*first = 1;; last = moved) {
        rolni_copy(m * n, K, before);
        if (rolni_riccatis(2 * n + 1, n, m, A, B, D, r, C, K, work) != ROLN_OK) return 0;
        moved = rolni_moved(n, m, r, C, K, before, work);
        if (last > 1) *first = moved;
        if (moved <= ROLN_SQRT(ROLN_EPS)) return 1;
        if (moved > last / 2 || rolni_policy(n, m, A, B, D, r, K, C, &steps, work) != ROLN_OK) return 0;
    }
}

/* The discrete algebraic Riccati equation, by structured doubling (SDA; Chu, Fan, Lin, Wang 2004) in factors, and the feedback of
   least cost:
       X = Q + A^T X A - A^T X B K,   K = (R + B^T X B)^-1 B^T X A,   u = -K x
   A [n][n], B [n][m], D [n][n] with Q = D^T D, r [m] the diagonal of R, above 0, in; C [n][n], upper triangular with X = C^T C,
   and K [m][n] out (it may be B), untouched unless ROLN_OK. Doubling k knows the cost of 2^k - 1 steps; 60 at most, 4 to 20 are
   usual, of about 40 n^3 multiply-adds. Where A is very unstable it loses digits. 2 n steps of roln_riccati bring them back where
   feedback is strong, which forgets its start. Where the closed loop is slower than that, policy iteration does so (Kleinman 1968):
   the cost of K, and the feedback that is best if that is the cost of what follows; errors square with every policy. Policies see
   A - B K, which cancels where A is unstable, so they are taken only where they mend more than that costs, and only once they are
   settled. Units of states and inputs change results by rounding errors only (test_riccati.c: test_state_units).
   ROLN_E_NOT_FINITE: an input; ROLN_E_NOT_SPD: r; ROLN_E_NO_CONVERGENCE, to working precision: B cannot stabilise A, or Q does not
   see what has to be stabilised. work [ROLN_DARE_WORK]. */
#define ROLN_DARE_MEM(X, n, m) X(X0, (n) * (n)) X(X1, (n) * (n)) X(K0, (m) * (n)) X(K1, (m) * (n))
#define ROLN_DARE_WORK(n, m) \
    (0 ROLN_DARE_MEM(ROLNI_SIZE, n, m) + ROLN_MAX(ROLNI_DOUBLE_WORK(n, m), ROLNI_POLICIES_WORK(n, m)))
ROLN_FN roln_status roln_dare(int n, int m, const roln_real *A, const roln_real *B, const roln_real *D, const roln_real *r,
                              roln_real *C, roln_real *K, roln_real *work)
{
    ROLN_DARE_MEM(ROLNI_CARVE, n, m)
    roln_status st;
    roln_real steps, first = 0;
    int i, good, better = 0;
    if (!roln_all_finite(n * n, A) || !roln_all_finite(n * m, B) || !roln_all_finite(n * n, D) || !roln_all_finite(m, r))
        return ROLN_E_NOT_FINITE;
    for (i = 0; i < m; i++)
        if (!(r[i] > 0)) return ROLN_E_NOT_SPD;
    st = rolni_double(n, m, A, B, D, r, X0, work);
    if (st == ROLN_OK) st = rolni_riccatis(2 * n, n, m, A, B, D, r, X0, K1, work);
    if (st == ROLN_OK) st = rolni_riccatis(1, n, m, A, B, D, r, X0, K0, work);
    if (st != ROLN_OK) return ROLN_E_NO_CONVERGENCE;
    good = rolni_moved(n, m, r, X0, K0, K1, work) <= ROLN_C(1e-3);
    if (rolni_policy(n, m, A, B, D, r, K0, X1, &steps, work) != ROLN_OK) return ROLN_E_NO_CONVERGENCE;
    if (steps > ROLNI_AS(roln_real, 2 * n)) { /* slow: the start is not forgotten */
        rolni_copy(m * n, K0, K1);
        better = rolni_policies(n, m, A, B, D, r, X1, K1, &first, work) && (!good || first > 1024 * ROLN_EPS);
    }
    if (!better && (!good || first > ROLN_C(0.1))) return ROLN_E_NO_CONVERGENCE;
    rolni_copy(n * n, better ? X1 : X0, C);
    rolni_copy(m * n, better ? K1 : K0, K);
    return ROLN_OK;
}

/* ---- 4 optimal control ----------------------------------------------------------------------- */

/* x_k+1 = A_k x_k + B_k (u_k - at_k) from x_0 = 0, at the least
       sum_k  1/2 x_k+1^T Q_k x_k+1 + q_k^T x_k+1 + 1/2 sum_j r_j (u_kj - ref_j)^2,   k = 0 .. steps - 1,
   among all u with |u_kj| <= most_j and |u_kj - u_k-1,j| <= rate_j. Each u_j and each x_i may have a unit of its own: other units
   change the solution by rounding only, and so does a limit that is never reached, however large
   (test_ocp.c: test_units, test_far). */
typedef struct {
    int n, m, steps;
    const roln_real *A, *B;   /* [steps][n][n], [steps][n][m] */
    const roln_real *Q, *q;   /* [steps][n][n] symmetric, positive semi-definite; [steps][n] */
    const roln_real *r, *ref; /* [m] above 0; [m] */
    const roln_real *at;      /* [steps][m] */
    const roln_real *rate;    /* [m] above 0; NULL: no limit of rates */
    const roln_real *last;    /* [m] u_-1, |last_j| <= most_j; read with rate only */
    const roln_real *most;    /* [m] above 0; NULL: 1, u is in units of its limits */
    const roln_real *less;    /* [steps][m] |u_kj| <= most_j - less_kj, 0 or more, below most_j; NULL: 0. With rate this limit is
                                 never lower than (|last_j| + v) / 2, v = max(0, |last_j| - (k + 1) rate_j / 4) */
} roln_ocp;

/* What roln_ocp_solve works on. Limits are sides of u_kj, 0 and 1 of its size, 2 and 3 of its rate: how far each is away, t, and
   its multiplier l, in [sides][steps][m]. d, dx, dl a step of Newton's method; c what products of the steps of t and l were when it
   went to the limits themselves. The solution keeps |u_j| <= |last_j| + room_j, which no limit and no cost lets it exceed; rate is
   cut where it is more than that allows. rated: 1 with limits of rate, sides = 2 + 2 rated. */
#define ROLN_OCP_MEM(X, n, m, steps, rated) \
    X(L, (steps) * (m) * (m)) /* Cholesky factors of the Hessian by u_k */ \
    X(Kl, (rated) * (steps) * (m) * (m)) /* feedback of u_k-1 */ \
    X(g, (steps) * (m)) X(d, (steps) * (m)) X(dx, ((steps) + 1) * (n)) \
    X(t, (2 + 2 * (rated)) * (steps) * (m)) X(l, (2 + 2 * (rated)) * (steps) * (m)) \
    X(dl, (2 + 2 * (rated)) * (steps) * (m)) X(c, (2 + 2 * (rated)) * (steps) * (m)) \
    X(P, (n) * (n)) X(Pl, (rated) * (n) * (m)) X(Pll, (rated) * (m) * (m)) /* cost to go of x, u_k-1 */ \
    X(F, (n) * (n)) X(G, (n) * (m)) X(S, (m) * (m)) X(Y, (m) * (n)) X(p, n) X(pl, m) X(v, n) \
    X(room, m) X(rate, (rated) * (m))
#define ROLN_OCP_WORK(n, m, steps, rated) (0 ROLN_OCP_MEM(ROLNI_SIZE, n, m, steps, rated))
typedef struct {
    const roln_ocp *of;
    int sides;
    roln_real *u, *x, *K;
    ROLN_OCP_MEM(ROLNI_FIELD, n, m, steps, rated)
} rolni_ocp;

/* How much t of number i of a side changes with u. */
ROLNI_INLINE roln_real rolni_ocp_moved(const rolni_ocp *b, int side, int i, const roln_real *u)
{
    const int m = b->of->m;
    const roln_real to = u[i] - (side > 1 && i >= m ? u[i - m] : 0);
    return side & 1 ? -to : to;
}

/* next [n] = A_k x + B_k w. */
ROLNI_INLINE void rolni_ocp_next(const roln_ocp *p, int k, const roln_real *x, const roln_real *w, roln_real *next)
{
    const int n = p->n, m = p->m;
    const roln_real *B = p->B + k * n * m;
    int i, j;
    roln_mm_bt(1, n, n, x, p->A + k * n * n, next);
    for (i = 0; i < n; i++, B += m)
        for (j = 0; j < m; j++)
            next[i] += B[j] * w[j];
}

/* x of u; w [m] is written. */
ROLN_FN void rolni_ocp_roll(const roln_ocp *p, const roln_real *u, roln_real *x, roln_real *w)
{
    const int n = p->n, m = p->m;
    int k, j;
    rolni_zero(n, x);
    for (k = 0; k < p->steps; k++) {
        for (j = 0; j < m; j++)
            w[j] = u[k * m + j] - p->at[k * m + j];
        rolni_ocp_next(p, k, x + k * n, w, x + (k + 1) * n);
    }
}

/* g = the gradient of the cost by u, backward in time: p_k = q + Q x + A^T p_k+1, g = r (u - ref) + B^T p. */
ROLN_FN void rolni_ocp_gradient(const rolni_ocp *b)
{
    const roln_ocp *o = b->of;
    const int n = o->n, m = o->m;
    int k, i, j;
    rolni_zero(n, b->v);
    for (k = o->steps - 1; k >= 0; k--) {
        roln_mm_bt(1, n, n, b->x + (k + 1) * n, o->Q + k * n * n, b->p);
        for (i = 0; i < n; i++)
            b->p[i] += o->q[k * n + i] + b->v[i];
        roln_mm(1, n, m, b->p, o->B + k * n * m, b->g + k * m);
        for (j = 0; j < m; j++)
            b->g[k * m + j] += o->r[j] * (b->u[k * m + j] - o->ref[j]);
        roln_mm(1, n, n, b->p, o->A + k * n * n, b->v);
    }
}

ROLNI_INLINE roln_real rolni_ocp_most(const roln_ocp *p, int j)
{
    return p->most ? p->most[j] : 1;
}

/* |u_-1,j|. */
ROLNI_INLINE roln_real rolni_ocp_last(const roln_ocp *p, int j)
{
    return p->rate ? ROLN_ABS(p->last[j]) : 0;
}

/* The most that any u_kj is away from the start. */
ROLNI_INLINE roln_real rolni_ocp_reach(const rolni_ocp *b, int j)
{
    const roln_ocp *o = b->of;
    const roln_real most = rolni_ocp_last(o, j) + b->room[j];
    return o->rate ? ROLN_MIN(most, o->rate[j] * ROLNI_AS(roln_real, o->steps + 1)) : most;
}

/* How far |u_kj| is below |u_-1,j| at the start: it goes to 0 at a quarter of the rate. */
ROLNI_INLINE roln_real rolni_ocp_fall(const roln_ocp *p, int k, int j)
{
    return p->rate ? ROLN_MIN(ROLN_ABS(p->last[j]), ROLNI_AS(roln_real, k + 1) * (p->rate[j] / 4)) : 0;
}

/* The limit of |u_kj|: less than most, but above where |u_kj| is at the start, last - fall. */
ROLNI_INLINE roln_real rolni_ocp_lower(roln_real most, roln_real less, roln_real last, roln_real fall)
{
    return ROLN_MAX(most - less, last - fall / 2);
}

ROLNI_INLINE roln_real rolni_ocp_top(const roln_ocp *p, int k, int j)
{
    const roln_real most = rolni_ocp_most(p, j);
    return p->less ? rolni_ocp_lower(most, p->less[k * p->m + j], rolni_ocp_last(p, j), rolni_ocp_fall(p, k, j)) : most;
}

/* room and rate. No u costs less than the start unless sum_kj r_j (u - start)^2 <= 4 sum_kj g^2 / r_j, which bounds how far the
   best u_j is away, in any unit. */
ROLN_FN void rolni_ocp_room(const rolni_ocp *b)
{
    const roln_ocp *o = b->of;
    const int m = o->m, count = o->steps * m;
    roln_real pull = 0;
    int i, j;
    for (i = 0; i < count; i++)
        pull += b->g[i] / o->r[i % m] * b->g[i];
    for (j = 0; j < m; j++) {
        const roln_real last = rolni_ocp_last(o, j), widest = 2 * ROLN_SQRT(pull / o->r[j]);
        roln_real room = rolni_ocp_most(o, j) - last;
        if (o->rate) room = ROLN_MIN(room, o->rate[j] * ROLNI_AS(roln_real, o->steps + 1));
        room = ROLN_MIN(room, widest > 0 ? widest : 1 / ROLN_SQRT(o->r[j])); /* 0: the start is the best there is */
        b->room[j] = room;
        if (o->rate) b->rate[j] = ROLN_MIN(o->rate[j], 3 * (last + room));
    }
}

#define ROLNI_OCP_LEAST ROLN_C(1e-36) /* a cost beside which every cost is large */

/* u = 0, in the middle of all limits, or on the way there from `last`; x, g; t from the way itself, which may be too short to
   change u in its digits; l so that all t l are half of the mean of |g| times reach, above 0, which is returned. */
ROLN_FN roln_real rolni_ocp_start(const rolni_ocp *b)
{
    const roln_ocp *o = b->of;
    const int m = o->m, count = o->steps * m;
    roln_real mean = 0, top = 0;
    int i, side;
    for (i = 0; i < count; i++) {
        const roln_real to = rolni_ocp_last(o, i % m) - rolni_ocp_fall(o, i / m, i % m);
        b->u[i] = o->rate && o->last[i % m] < 0 ? -to : to;
    }
    rolni_ocp_roll(o, b->u, b->x, b->pl);
    rolni_ocp_gradient(b);
    rolni_ocp_room(b);
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            const int j = i % m, away = (side & 1) != (o->rate && o->last[j] < 0); /* from this side */
            const roln_real last = rolni_ocp_last(o, j), room = ROLN_MIN(b->room[j], rolni_ocp_top(o, i / m, j) - last);
            const roln_real fall = rolni_ocp_fall(o, i / m, j), step = fall - rolni_ocp_fall(o, i / m - 1, j);
            b->t[side * count + i] = side > 1 ? b->rate[j] + (away ? step : -step) : room + (away ? fall : 2 * last - fall);
        }
    for (i = 0; i < count; i++) {
        const roln_real reach = rolni_ocp_reach(b, i % m);
        mean += ROLN_ABS(b->g[i]) * reach / ROLNI_AS(roln_real, count);
        top = ROLN_MAX(top, o->r[i % m] * reach * reach);
    }
    mean = ROLN_MAX(mean / 2, ROLN_EPS * top + ROLNI_OCP_LEAST); /* where the start is the best there is */
    for (i = 0; i < b->sides * count; i++)
        b->l[i] = mean / b->t[i];
    return mean;
}

/* Row i of Y [m][n] becomes that of L^-1 Y by the rows before, or, back, that of -L^-T Y by those behind. Four columns at once, in
   registers. */
ROLNI_INLINE void rolni_ocp_row(int m, int n, int i, int back, const roln_real *L, roln_real *Y)
{
    const int from = back ? i + 1 : 0, to = back ? m : i, step = back ? m : 1;
    const roln_real sign = ROLNI_AS(roln_real, back ? 1 : -1), by = -sign / L[i * m + i]; /* it takes as long as many products */
    const roln_real *const l = L + (back ? i : i * m);
    roln_real *const y = Y + i * n;
    int j, k;
    for (j = 0; j < n - n % 4; j += 4) {
        roln_real y0 = y[j], y1 = y[j + 1], y2 = y[j + 2], y3 = y[j + 3];
        for (k = from; k < to; k++) {
            const roln_real c = sign * l[k * step], *const x = Y + k * n + j;
            y0 += c * x[0], y1 += c * x[1], y2 += c * x[2], y3 += c * x[3];
        }
        y[j] = y0 * by, y[j + 1] = y1 * by, y[j + 2] = y2 * by, y[j + 3] = y3 * by;
    }
    for (; j < n; j++) {
        roln_real y0 = y[j];
        for (k = from; k < to; k++)
            y0 += sign * l[k * step] * Y[k * n + j];
        y[j] = y0 * by;
    }
}

/* Y [m][n] = -(L L^T)^-1 Y. */
ROLN_FN void rolni_ocp_solve(int m, int n, const roln_real *L, roln_real *Y)
{
    int i;
    for (i = 0; i < m; i++)
        rolni_ocp_row(m, n, i, 0, L, Y);
    for (i = m - 1; i >= 0; i--)
        rolni_ocp_row(m, n, i, 1, L, Y);
}

/* Sum of l / t of the two sides of u_kj: what its limits add to the curvature. */
ROLNI_INLINE roln_real rolni_ocp_stiff(const rolni_ocp *b, int side, int at)
{
    const int count = b->of->steps * b->of->m, i = side * count + at, k = i + count;
    return b->l[i] / b->t[i] + b->l[k] / b->t[k];
}

/* Feedback du = K dx + Kl du_k-1, backward in time, P, Pl, Pll the cost to go of x_k+1 and u_k:
       S = R + B^T P B + Pl^T B + B^T Pl + Pll = L L^T,   Y = (B^T P + Pl^T) A,   K = -S^-1 Y,   Kl = S^-1 V
       P = Q + A^T P A + Y^T K,   Pl = Y^T Kl,   Pll = V - V S^-1 V = (S - V) Kl
   R and V have in them what limits of size and of rate add. ROLN_E_NOT_SPD. */
ROLN_FN roln_status rolni_ocp_factor(const rolni_ocp *b)
{
    const roln_ocp *o = b->of;
    const int n = o->n, m = o->m, rated = b->sides > 2;
    int k, i, j;
    rolni_zero(rated * n * m, b->Pl);
    rolni_zero(rated * m * m, b->Pll);
    rolni_copy(n * n, o->Q + (o->steps - 1) * n * n, b->P);
    for (k = o->steps - 1;; k--) {
        const roln_real *A = o->A + k * n * n, *B = o->B + k * n * m;
        roln_real *const L = b->L + k * m * m, *const K = b->K + k * m * n, *const Kl = b->Kl + k * m * m;
        roln_mm(n, n, m, b->P, B, b->G);
        rolni_zero(m * m, b->S);
        for (i = 0; rated && i < n * m; i++)
            b->G[i] += b->Pl[i];
        roln_mm_at(m, n, m, B, b->G, b->S);
        if (rated) {
            roln_mm_at(m, n, m, b->Pl, B, b->S);
            for (i = 0; i < m * m; i++)
                b->S[i] += b->Pll[i];
        }
        for (j = 0; j < m; j++)
            b->S[j * (m + 1)] += o->r[j] + rolni_ocp_stiff(b, 0, k * m + j);
        rolni_copy(m * m, b->S, L);
        for (j = 0; rated && j < m; j++)
            L[j * (m + 1)] += rolni_ocp_stiff(b, 2, k * m + j);
        if (roln_chol(m, L, L) != ROLN_OK) return ROLN_E_NOT_SPD;
        rolni_zero(m * n, b->Y);
        roln_mm_at(m, n, n, b->G, A, b->Y);
        rolni_copy(m * n, b->Y, K);
        rolni_ocp_solve(m, n, L, K);
        if (rated) {
            rolni_zero(m * m, Kl);
            rolni_zero(n * m, b->Pl);
            for (j = 0; j < m; j++)
                Kl[j * (m + 1)] = -rolni_ocp_stiff(b, 2, k * m + j);
            rolni_ocp_solve(m, m, L, Kl);
            roln_mm_at(n, m, m, b->Y, Kl, b->Pl);
            roln_mm(m, m, m, b->S, Kl, b->Pll);
        }
        if (k == 0) return ROLN_OK;
        roln_mm(n, n, n, b->P, A, b->F);
        rolni_copy(n * n, o->Q + (k - 1) * n * n, b->P);
        roln_mm_at(n, n, n, A, b->F, b->P);
        roln_mm_at(n, m, n, b->Y, K, b->P);
        for (i = 0; i < n; i++) /* rounding errors make it unsymmetric, and the next step would make more of them */
            for (j = 0; j < i; j++)
                b->P[i * n + j] = b->P[j * n + i] = (b->P[i * n + j] + b->P[j * n + i]) / 2;
    }
}

/* The Newton step d, dx, dl to products t l = mu - c. */
ROLN_FN void rolni_ocp_step(const rolni_ocp *b, roln_real mu)
{
    const roln_ocp *o = b->of;
    const int n = o->n, m = o->m, count = o->steps * m, rated = b->sides > 2;
    int k, i, j, side;
    rolni_copy(count, b->g, b->d);
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            const int at = side * count + i;
            const roln_real push = (side & 1 ? -1 : 1) * (mu - b->c[at]) / b->t[at];
            b->d[i] -= push;
            if (side > 1 && i >= m) b->d[i - m] += push;
        }
    rolni_zero(n, b->p);
    rolni_zero(m, b->pl);
    for (k = o->steps - 1; k >= 0; k--) { /* d = -S^-1 (gradient + B^T p + pl) */
        roln_real *const d = b->d + k * m;
        rolni_mm1(n, m, 0, b->p, 1, o->B + k * n * m, 1, d);
        for (j = 0; j < m; j++)
            d[j] += b->pl[j];
        rolni_mm1(n, n, 0, b->p, 1, o->A + k * n * n, 0, b->v);
        rolni_mm1(m, n, 0, d, 1, b->K + k * m * n, 1, b->v);
        rolni_copy(n, b->v, b->p);
        if (rated) rolni_mm1(m, m, 0, d, 1, b->Kl + k * m * m, 0, b->pl);
        rolni_ocp_solve(m, 1, b->L + k * m * m, d);
    }
    rolni_zero(n, b->dx);
    for (k = 0; k < o->steps; k++) {
        roln_real *const d = b->d + k * m;
        for (j = 0; j < m; j++) {
            d[j] += roln_dot(n, b->K + (k * m + j) * n, b->dx + k * n);
            if (rated && k > 0) d[j] += roln_dot(m, b->Kl + (k * m + j) * m, d - m);
        }
        rolni_ocp_next(o, k, b->dx + k * n, d, b->dx + (k + 1) * n);
    }
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            const int at = side * count + i;
            b->dl[at] = (mu - b->c[at] - b->l[at] * rolni_ocp_moved(b, side, i, b->d)) / b->t[at] - b->l[at];
        }
}

/* The largest part of a step, at most 1, that takes no t, no l nearer to 0 than by the part most of what it is; *mu: the mean of
   t l there. */
ROLN_FN roln_real rolni_ocp_length(const rolni_ocp *b, roln_real most, roln_real *mu)
{
    const int m = b->of->m, count = b->of->steps * m;
    roln_real a = 1, sum = 0;
    int i, side, at;
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            const roln_real dt = rolni_ocp_moved(b, side, i, b->d);
            at = side * count + i;
            if (-dt * a > most * b->t[at]) a = -most * b->t[at] / dt;
            if (-b->dl[at] * a > most * b->l[at]) a = -most * b->l[at] / b->dl[at];
        }
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            at = side * count + i;
            sum += (b->t[at] + a * rolni_ocp_moved(b, side, i, b->d)) * (b->l[at] + a * b->dl[at]);
        }
    *mu = sum / ROLNI_AS(roln_real, b->sides * count);
    return a;
}

ROLN_FN roln_status rolni_ocp_check(const roln_ocp *p)
{
    const int n = p->n, m = p->m, H = p->steps;
    int i, j;
    if (n < 1 || m < 1 || H < 1) return ROLN_E_LENGTH;
    if (!roln_all_finite(H * n * n, p->A) || !roln_all_finite(H * n * m, p->B) || !roln_all_finite(H * n * n, p->Q) ||
        !roln_all_finite(H * n, p->q) || !roln_all_finite(m, p->r) || !roln_all_finite(m, p->ref) ||
        !roln_all_finite(H * m, p->at))
        return ROLN_E_NOT_FINITE;
    for (j = 0; j < m; j++) {
        const roln_real most = rolni_ocp_most(p, j);
        if (!(p->r[j] > 0)) return ROLN_E_NOT_SPD;
        if (!roln_finite(most) || !(most > 0)) return ROLN_E_RANGE;
        if (p->rate && (!roln_finite(p->rate[j]) || !(p->rate[j] > 0) || !(ROLN_ABS(p->last[j]) <= most))) return ROLN_E_RANGE;
    }
    for (i = 0; p->less && i < H * m; i++)
        if (!(p->less[i] >= 0 && p->less[i] < rolni_ocp_most(p, i % m))) return ROLN_E_RANGE;
    return ROLN_OK;
}

/* u within its limits in spite of rounding errors. */
ROLN_FN void rolni_ocp_clip(const roln_ocp *p, roln_real *u)
{
    int i;
    for (i = 0; i < p->steps * p->m; i++) {
        const roln_real last = !p->rate ? 0 : i < p->m ? p->last[i] : u[i - p->m], most = rolni_ocp_top(p, i / p->m, i % p->m);
        const roln_real low = p->rate ? ROLN_MAX(-most, last - p->rate[i % p->m]) : -most;
        const roln_real high = p->rate ? ROLN_MIN(most, last + p->rate[i % p->m]) : most;
        u[i] = u[i] < low ? low : u[i] > high ? high : u[i];
    }
}

/* The cost of u is at most that much above the least: sum t l, and what stationarity lacks, times the most that u could move. */
ROLN_FN roln_real rolni_ocp_gap(const rolni_ocp *b)
{
    const int m = b->of->m, count = b->of->steps * m;
    roln_real gap = 0;
    int i, side;
    for (side = 0; side < b->sides; side++)
        for (i = 0; i < count; i++) {
            const roln_real l = b->l[side * count + i], push = side & 1 ? -l : l;
            gap += b->t[side * count + i] * l;
            b->g[i] -= push;
            if (side > 1 && i >= m) b->g[i - m] += push;
        }
    for (i = 0; i < count; i++)
        gap += 2 * rolni_ocp_reach(b, i % m) * ROLN_ABS(b->g[i]);
    return gap;
}

/* Primal-dual interior points (Mehrotra 1992), each step of Newton's method by a Riccati recursion, from u = 0 on. On its way u is
   strictly inside of all limits, so that they hold wherever it ends. It takes `iterations` steps, no fewer. Of what the start costs
   more than the best, 6 steps (8 with limits of rate) leave at most 0.005, and a thousandth or less in 99 of 100 problems of
   test_ocp.c: test_left. The worst of 25,000 others was 0.016, and 0.22 where one of two motors is at its limit and that of the
   other is never reached. In float, digits may leave more where the motion is unstable. *gap tells in all cases: the cost of u is
   at most that much above the least. u [steps][m], x [steps + 1][n] out; K [steps][m][n]: feedback u_k - K_k dx_k of least cost
   about x, in which what is at a limit hardly moves (with limits of rate for the u_k-1 of the solution). u, x, K hold no result
   unless ROLN_OK. ROLN_E_LENGTH: a size, or iterations, below 1; ROLN_E_RANGE: most, less, rate or last; ROLN_E_NOT_SPD: r, or a
   Hessian by u_k, as an indefinite Q may make it, which is not checked itself, or where weights, or rates and limits, are too far
   apart for the digits (rates down to 1e-24 of a limit are not: test_at_limit); ROLN_E_NOT_FINITE: another input. Each step of each
   iteration costs about 3 n^3 + 5 n^2 m + 3 n m^2 multiply-adds.
   work [ROLN_OCP_WORK]. */
ROLN_FN roln_status roln_ocp_solve(const roln_ocp *p, int iterations, roln_real *u, roln_real *x, roln_real *K, roln_real *gap,
                                   roln_real *work)
{
    const int n = p->n, m = p->m, steps = p->steps, rated = p->rate != NULL, count = steps * m;
    const roln_real least = rated ? ROLN_EPS / 8 : ROLN_EPS / 1024; /* below, steps are rounding errors */
    roln_real mu, floor, part, ahead;
    roln_status st = rolni_ocp_check(p);
    rolni_ocp ocp, *const b = &ocp;
    int i, k, side;
    if (st == ROLN_OK && iterations < 1) st = ROLN_E_LENGTH;
    if (st != ROLN_OK) return st;
    ROLN_OCP_MEM(ROLNI_LAY, n, m, steps, rated)
    b->of = p, b->sides = 2 + 2 * rated, b->u = u, b->x = x, b->K = K;
    mu = rolni_ocp_start(b), floor = 0;
    for (k = 0; k < iterations; k++) {
        if ((st = rolni_ocp_factor(b)) != ROLN_OK) return st;
        rolni_zero(b->sides * count, b->c);
        rolni_ocp_step(b, 0);
        (void)rolni_ocp_length(b, 1, &ahead);
        if (k == 0) floor = ROLN_MAX(least * ahead, ROLNI_OCP_LEAST); /* of what there is to gain, not of far limits */
        for (side = 0; side < b->sides; side++)
            for (i = 0; i < count; i++)
                b->c[side * count + i] = rolni_ocp_moved(b, side, i, b->d) * b->dl[side * count + i];
        part = ahead / mu;
        mu = ROLN_MAX(floor, part * part * part * mu);
        rolni_ocp_step(b, mu);
        part = rolni_ocp_length(b, ROLN_C(0.999), &mu);
        for (side = 0; side < b->sides; side++)
            for (i = 0; i < count; i++) {
                const int at = side * count + i;
                b->t[at] += part * rolni_ocp_moved(b, side, i, b->d);
                b->l[at] += part * b->dl[at];
            }
        for (i = 0; i < count; i++)
            u[i] += part * b->d[i];
        for (i = 0; i < (steps + 1) * n; i++)
            x[i] += part * b->dx[i];
        rolni_ocp_gradient(b);
    }
    if (gap) *gap = rolni_ocp_gap(b);
    for (i = 0; i < steps * m * n; i++)
        K[i] = -K[i];
    rolni_ocp_clip(p, u);
    if (!roln_all_finite(count, u) || !roln_all_finite((steps + 1) * n, x) || !roln_all_finite(steps * m * n, K))
        return ROLN_E_NOT_FINITE;
    return ROLN_OK;
}

/* ---- 5 feedback, estimates and plans --------------------------------------------------------- */

/* Cost of feedback, a step: sum q_i dq_i^2 + sum qd_i dqd_i^2 + sum u_j du_j^2, of deviations of joints dq = J dz,
   dqd = J dzd, and of motors du. Weights are of joints and motors, since z has no unit that means anything: 1 / d^2, where all
   these deviations d are equally bad. */
typedef struct {
    const roln_real *q, *qd;   /* [N] 1/rad^2, s^2/rad^2; 0 or more */
    const roln_real *u;        /* [count] 1/(Nm)^2, above 0 */
    roln_real dt;              /* a step, s: as long as u is held */
    const roln_motors *motors; /* NULL: one at each joint, or the learned inputs: count = roln_force_size; mu is not read */
} roln_cost;

/* The force [roln_force_size] that motors make by u [count]: B u, in tau [N], or u itself where they are the force. */
ROLN_FN const roln_real *rolni_motors_tau(int N, const roln_motors *f, const roln_real *u, roln_real *tau)
{
    if (!f || !f->B || !u) return u;
    roln_mm_bt(1, f->count, N, u, f->B, tau);
    return tau;
}

/* What acts over a step of dt seconds: motors, NULL: at each joint, or the learned inputs; their u [count], NULL: none; a load [n]
   on z, NULL: none. */
typedef struct {
    const roln_motors *motors;
    const roln_real *u, *load;
    roln_real dt;
} rolni_acting;

/* How a step is taken. ROLNI_TURN: angles far out are brought within (-pi, pi] first; else they stay on their turns, for
   differences of states. ROLNI_SLIDE: with ROLN_STICTION the derivatives are those of a step without dry friction, in which nothing
   is held. ROLNI_LOOK: with ROLN_FILTER leapfrog a step of leapfrog. */
#define ROLNI_TURN 1
#define ROLNI_SLIDE 2
#define ROLNI_LOOK 4

/* The same as a torque tau [force_size], NULL: none, and how. */
typedef struct {
    const roln_real *tau, *load;
    roln_real dt;
    int how;
} rolni_push;

/* Derivatives of a step by its state, A [2n][2n], and by its torque, B [2n][force_size], or by its load, L [2n][n]; B, L NULL:
   not wanted. */
typedef struct {
    roln_real *A, *B, *L;
} rolni_slopes;

/* Is P [n][n] symmetric and positive semi-definite to rounding errors? Each is asked in units in which the diagonal of P is 1, so
   the answer does not depend on units of states. L [n][n] is written. ROLN_E_NOT_FINITE, ROLN_E_NOT_SPD. */
ROLN_FN roln_status rolni_goal_weighs(int n, const roln_real *P, roln_real *L)
{
    const roln_real rest = ROLN_EPS * ROLNI_AS(roln_real, 8 * n);
    int i, j;
    if (!roln_all_finite(n * n, P)) return ROLN_E_NOT_FINITE;
    rolni_copy(n * n, P, L);
    for (i = 0; i < n; i++) {
        const roln_real p = P[i * (n + 1)];
        if (p < 0) return ROLN_E_NOT_SPD;
        for (j = 0; j < i; j++) {
            const roln_real most = ROLN_SQRT(p) * ROLN_SQRT(P[j * (n + 1)]), x = P[i * n + j];
            if (ROLN_ABS(x - P[j * n + i]) > rest * most || ROLN_ABS(x) > (1 + rest) * most) return ROLN_E_NOT_SPD;
        }
        L[i * (n + 1)] = p > 0 ? p + rest * p : 1; /* the row of a state without cost is 0 */
    }
    return roln_chol(n, L, L);
}

/* C of P = C^T C, P [n2][n2]: by eigenvalues of P with its diagonal scaled to 1, so that light states keep their digits beside
   heavy ones (test_feedback.c: test_light_states). l [n2], work [ROLN_EIG_WORK(n2)]. */
ROLN_FN roln_status rolni_lqr_end(int n2, const roln_real *P, roln_real *C, roln_real *l, roln_real *work)
{
    roln_status st = rolni_goal_weighs(n2, P, C);
    int i, j;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) {
            const roln_real most = ROLN_SQRT(P[i * (n2 + 1)]) * ROLN_SQRT(P[j * (n2 + 1)]);
            C[i * n2 + j] = most > 0 ? P[i * n2 + j] / most : 0;
        }
    if ((st = roln_eig(n2, C, l, C, work)) != ROLN_OK) return st;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            C[i * n2 + j] *= l[i] > 0 ? ROLN_SQRT(l[i]) * ROLN_SQRT(P[j * (n2 + 1)]) : 0;
    return ROLN_OK;
}

/* Noise of a machine and of its encoders, for a filter. */
typedef struct {
    roln_real dt;   /* time from tick to tick, s */
    roln_real q;    /* deviation of a measured joint from phi(z), rad: the root of noise^2 (of an encoder: its step / sqrt(12))
                       plus the mean square of q - phi(rho(q)), what the chart leaves of the joint */
    roln_real tau;  /* deviation of a torque on each joint that nobody knows, held over a tick, in the model's unit: its error;
                       of joints with units of their own tau / each_j */
    roln_real gate; /* deviations from what is expected beyond which a measured joint is not used; 0: every one is */
    int lost;       /* ticks in a row that are bridged in which gates leave fewer joints than coordinates; with as many joints as
                       coordinates one joint beyond its gate is enough */
    /* what follows may be left out */
    const roln_real *q_each, *tau_each; /* [N] in place of q, of tau; NULL: these */
    roln_real load; /* deviation by which the torque of a load on each joint wanders in a second, as tau; 0: there is none */
} roln_noise;

/* Bits of NAME_filter_tick that no guard uses. It also returns ROLN_FAULT_INPUT, ROLN_FAULT_STATUS and ROLN_FAULT_RANGE, with
   meanings of its own (docs/task.md). */
#define ROLN_FILTER_MISSING 512u  /* A joint was not measured. */
#define ROLN_FILTER_OUTLIER 1024u /* A measured joint is beyond noise.gate and was not used. */
#define ROLN_FILTER_START 2048u   /* The filter started at the measured pose, at rest. */
#define ROLN_FILTER_NONE 4096u    /* There is no estimate. The filter waits for every joint or for valid settings. */

/* Returns the name of the lowest bit of a word of faults and one sentence about it. The word is that of NAME_tick or
   NAME_guard_tick; of a filter's, bits below 512 mean other things (docs/task.md). To print all bits:
   for (; faults; faults &= faults - 1) puts(roln_fault_text(faults)); 0 gives "no fault", a bit that has no name "unknown fault".
   The texts are linked only into programs that call this function (test_safety.c: test_texts). */
ROLN_FN const char *roln_fault_text(uint32_t faults)
{
    static const char *const text[] = {
        "ROLN_FAULT_INPUT: q, qd, dt, a limit or the motors are not usable numbers.",
        "ROLN_FAULT_STATUS: A function on the way returned a status other than ROLN_OK.",
        "ROLN_FAULT_OUTPUT: A torque is NaN or infinite.",
        "ROLN_FAULT_LIMIT: A torque is beyond a limit of torque or rate, and limits.strict is 1.",
        "ROLN_FAULT_RANGE: z or zd is outside the range of the training data, widened by limits.margin, or beyond limits.novelty.",
        "ROLN_FAULT_ENERGY: |dE/dt - zd^T (J^T tau - d)| is beyond limits.residual.",
        "ROLN_FAULT_EXPIRED: More than limits.hold bad ticks or alarms in a row: safe torques until guard.g is zeroed.",
        "ROLN_FAULT_MANIFOLD: q or qd is farther than q_tolerance or qd_tolerance from what the model can represent.",
        "ROLN_CLIPPED: A torque was clipped to a limit of torque or rate. This is no fault.",
        "ROLN_FILTER_MISSING: A joint was not measured.",
        "ROLN_FILTER_OUTLIER: A measured joint is beyond noise.gate and was not used.",
        "ROLN_FILTER_START: The filter started at the measured pose, at rest.",
        "ROLN_FILTER_NONE: There is no estimate. The filter waits for every joint or for valid settings.",
    };
    int i;
    for (i = 0; i < ROLNI_AS(int, sizeof text / sizeof *text); i++)
        if (faults & (1u << i)) return text[i];
    return faults ? "unknown fault" : "no fault";
}

/* State of a filter, beside its estimate. Zero-initialised: it starts with the first measurement. */
typedef struct {
    uint32_t faults;           /* sticky: the bits of all ticks so far */
    uint32_t outliers, starts; /* measured joints that were not used, starts; of all ticks so far, at most 2^32 - 1 */
    int valid;                 /* 1: there is an estimate */
    int lost;                  /* lost ticks in a row */
    int used;                  /* joints that the last tick used */
    roln_real nis;             /* its normalised innovation squared: if all is well, chi-square of `used` degrees */
} roln_filter;

/* Nonzero if the settings of N joints make sense: finite, dt and deviations of joints positive, nothing negative. */
ROLN_FN int rolni_noise_valid(int N, const roln_noise *noise)
{
    const roln_real of[4] = {noise->dt, noise->gate, noise->q_each ? 1 : noise->q, noise->tau_each ? 0 : noise->tau};
    int i, valid = roln_all_finite(4, of) && of[0] > 0 && of[1] >= 0 && of[2] > 0 && of[3] >= 0 && noise->lost >= 0;
    for (i = 0; noise->q_each && i < N; i++)
        valid &= roln_finite(noise->q_each[i]) && noise->q_each[i] > 0;
    for (i = 0; noise->tau_each && i < N; i++)
        valid &= roln_finite(noise->tau_each[i]) && noise->tau_each[i] >= 0;
    return valid;
}

/* What a measurement said. */
typedef struct {
    int measured, used; /* joints */
    roln_real nis;
} rolni_innovation;

/* A count that never ends: it stays at the largest number. */
ROLN_FN uint32_t rolni_counted(uint32_t count, int more)
{
    const uint32_t left = UINT32_MAX - count, add = ROLNI_AS(uint32_t, more);
    return count + ROLN_MIN(add, left);
}

/* After a measurement, of n coordinates: outliers are counted, and an estimate that has lost most joints too often is none. */
ROLN_FN uint32_t rolni_filter_lost(roln_filter *filter, int lost, int n, const rolni_innovation *in)
{
    filter->outliers = rolni_counted(filter->outliers, in->measured - in->used);
    if (in->used < in->measured && in->used < n) {
        if (filter->lost < lost) filter->lost++;
        else filter->valid = 0;
    } else if (in->used > 0) {
        filter->lost = 0;
    }
    return in->used < in->measured ? ROLN_FILTER_OUTLIER : 0;
}

/* After a try to start: is there an estimate now? */
ROLN_FN int rolni_filter_starts(roln_filter *filter, uint32_t faults)
{
    filter->valid = (faults & ROLN_FILTER_START) != 0;
    filter->starts = rolni_counted(filter->starts, filter->valid);
    filter->lost = 0;
    return filter->valid;
}

/* One part of what a plan shall cost: sum_i weight_i (y_i - ref_i)^2 at every step, y = C x of a part x of the state. With low or
   high it is a soft limit instead. It costs sum_i weight_i e_i^2, where e_i is how far y_i is beyond low_i or high_i, else 0. */
enum { ROLN_OF_Q, ROLN_OF_QD, ROLN_OF_Z, ROLN_OF_ZD };
typedef struct {
    int of;                  /* x: ROLN_OF_.. */
    int count;               /* outputs y; without C not read */
    const roln_real *C;      /* [count][N or n]; NULL: y = x, and angles count by the shortest turn */
    const roln_real *weight; /* [count] 0 or more: 1 / d^2, where all deviations d are equally bad */
    const roln_real *ref;    /* [count], or with moving [steps][count], row k for the end of step k; not read with low or high */
    int moving;
    roln_real last;          /* at the last step the weights are 1 + last times as large */
    /* what follows may be left out */
    const roln_real *low, *high; /* [count] limits, low <= high; one NULL, low -inf, high inf: no limit. An angle without C is on
                                    the turn that is next to the middle of its limits, or to the only one */
    const roln_real *tighten;    /* [steps][count] 0 or more: behind step k the limits are so far inside (NAME_plan_tighten). Where
                                    low is then above high, both cost, the least in the middle between them; NULL: 0 */
} roln_term;

/* Goal of a plan, and the limits of the guard behind it. */
typedef struct {
    roln_real dt; /* a step, s: as long as u is held */
    int terms;
    const roln_term *term;
    const roln_real *u;        /* [motors] cost u_j (tau_j - hold_j)^2, 1/(Nm)^2, above 0 */
    const roln_real *hold;     /* [motors] what the motors give when nothing is to be done; NULL: 0 */
    const roln_limits *limits; /* of motors, tau, tau_each, rate, rate_each, margin; all others have to make sense, too */
    /* what follows may be left out */
    int iterations;            /* of roln_ocp_solve; 0: 6, with limits of rate 8 */
    const roln_real *P, *end;  /* cost of all that comes after the last step, (s - end)^T P (s - end), of NAME_lqr say: [2n][2n],
                                  [2n] = [z; zd]; P NULL: none */
    const roln_real *load;     /* [n] constant force on z, J, that plans count on, of a filter say; NULL: none */
    const roln_real *reserve;  /* [steps][motors] 0 or more, below tau: so much of the torque of a step is left to feedback, which
                                  may use all of it (NAME_plan_tighten). Limits of rate that cannot follow go first; NULL: none */
} roln_goal;

/* State of a plan, zero-initialised: there is none. */
typedef struct {
    int valid;      /* 1: there is a plan */
    int age;        /* steps since it was made: calls of NAME_plan_next since then, all of which failed */
    roln_real cost; /* of it, as the model expects */
    roln_real duality_gap; /* of roln_ocp_solve, whose solution the plan is, or a part of the way to it: the cost of the linearised
                              goal is at most that much above the least. Much of `cost`, call after call: more iterations or fewer
                              digits are needed */
} roln_plan;

/* Largest number of iterations. */
#define ROLN_PLAN_ITERATIONS 64

/* ---- 6 windows, losses and errors ------------------------------------------------------------ */

/* Windows of recorded motion. Window w has samples start[w] + h stride, h = 0 .. steps, of the arrays. */
typedef struct {
    int count, steps;        /* windows; steps of each (0 in the acceleration loss) */
    int stride;              /* samples per step, 1 or more */
    const int *start;        /* [count] first sample of each window; NULL: they follow each other */
    const roln_real *q, *qd; /* [samples][N]; qd NULL: positions only, the ODE loss becomes the variational loss */
    const roln_real *qdd;    /* [samples][N], acceleration loss only */
    const roln_real *tau;    /* [samples][NAME_force_size] held from each sample to the next (mean over a step); NULL: none */
} roln_batch;

/* Weights of the terms of a loss, and the terms themselves: mean squared Euclidean norms, in scaled units. */
typedef struct {
    roln_real q, qd, qdd;                /* reconstruction: phi(rho(q)) - q, J D qd - qd, and of the 3-jet */
    roln_real z, zd, zdd;                /* latent prediction minus encoded data */
    roln_real q_pred, qd_pred, qdd_pred; /* decoded prediction minus data */
    roln_real force;                     /* inverse dynamics: M zdd + c + g + d - tau_z, of the acceleration loss */
} roln_loss;

/* Sum of the terms, each times its weight. */
ROLN_FN roln_real roln_loss_total(const roln_loss *weights, const roln_loss *l)
{
    return weights->q * l->q + weights->qd * l->qd + weights->qdd * l->qdd + weights->z * l->z + weights->zd * l->zd +
           weights->zdd * l->zdd + weights->q_pred * l->q_pred + weights->qd_pred * l->qd_pred +
           weights->qdd_pred * l->qdd_pred + weights->force * l->force;
}

/* The paper's unit weights: ODE loss over H steps (Eq. 13), acceleration loss (Eq. 12). */
#define ROLN_ODE_WEIGHTS {1, 1, 0, 0, 1, 0, 0, 1, 0, 0}
#define ROLN_ACC_WEIGHTS {1, 1, 1, 0, 0, 1, 0, 0, 1, 0}
#define ROLN_POSITION_WEIGHTS {1, 0, 0, 1, 0, 0, 1, 0, 0, 0} /* variational loss: positions only */

/* Nonzero if the numbers of a batch make sense. */
ROLN_FN int rolni_batch_valid(const roln_batch *b)
{
    return b->count >= 0 && b->steps >= 0 && b->stride >= 1;
}

/* Sample of window w at step h. */
ROLN_FN size_t rolni_sample(const roln_batch *b, int w, int h)
{
    const size_t stride = ROLNI_AS(size_t, b->stride), length = ROLNI_AS(size_t, b->steps) * stride;
    return (b->start ? ROLNI_AS(size_t, b->start[w]) : ROLNI_AS(size_t, w) * (length + 1)) + ROLNI_AS(size_t, h) * stride;
}

/* One field of the nb windows from w0, at step h, scaled into X [nb][N]. */
ROLN_FN void rolni_gather(const roln_batch *b, const roln_real *field, int N, int w0, int nb, int h, roln_real scale, roln_real *X)
{
    int r, i;
    for (r = 0; r < nb; r++) {
        const roln_real *f = field + rolni_sample(b, w0 + r, h) * ROLNI_AS(size_t, N);
        for (i = 0; i < N; i++)
            X[r * N + i] = f[i] * scale;
    }
}

/* sum [n] += rest [n], and rest becomes what sum has lost by rounding (two-sum, Knuth 1969). A long sum whose parts are added to
   rest, each of which is then folded, has twice the digits (Kahan 1965). */
ROLN_FN void rolni_fold(int n, roln_real *sum, roln_real *rest)
{
    int i;
    for (i = 0; i < n; i++) {
        const roln_real a = sum[i], b = rest[i];
#if defined(__FAST_MATH__) || defined(__ASSOCIATIVE_MATH__)
        const volatile roln_real s = a + b, c = s - a; /* not to be simplified */
#else
        const roln_real s = a + b, c = s - a;
#endif
        rest[i] = (a - (s - c)) + (b - c);
        sum[i] = s;
    }
}

/* Mean over the stride samples of step h of the force in b->tau [samples][N], scaled. */
ROLN_FN void rolni_gather_tau(const roln_batch *b, int N, int w0, int nb, int h, roln_real scale, roln_real *X)
{
    int r, i, k;
    for (r = 0; r < nb; r++) {
        const roln_real *f = b->tau + rolni_sample(b, w0 + r, h) * ROLNI_AS(size_t, N), c = scale / ROLNI_AS(roln_real, b->stride);
        for (i = 0; i < N; i++) {
            roln_real sum = 0, rest = 0;
            for (k = 0; k < b->stride; k++) {
                rest += f[ROLNI_AS(size_t, k) * ROLNI_AS(size_t, N) + ROLNI_AS(size_t, i)];
                rolni_fold(1, &sum, &rest);
            }
            X[r * N + i] = c * sum;
        }
    }
}

/* Where the backward of a block goes. A gradient: of the autoencoder and of all behind it (ae, net; NULL: not wanted) is the sum
   over windows, loss gets the unweighted terms, windows their number. A row (signs not NULL, one window): ae, net are the
   derivative of the number sum_i xi_i sqrt(weight_i) (model - data)_i over all that the loss compares, xi_i = +-1 drawn from signs,
   and residual that number with the other sign: E residual^2 is the loss, E row^T row its Gauss-Newton matrix. rest: another
   gradient, all of whose numbers are zeroed with these; it keeps what these lose by rounding, so that sums do not become worse
   with the number of windows. NULL: the sums are plain. force_variance [n]: the force residual of each latent coordinate is divided
   by its root. NULL: it is not divided. */
typedef struct rolni_gradient {
    roln_real *ae, *net;
    roln_loss *loss;
    roln_real *windows;
    uint64_t *signs;
    roln_real *residual;
    const struct rolni_gradient *rest;
    const roln_real *force_variance;
} roln_gradient;

/* The gradient by all parameters, theta [roln_params]; of an autoencoder that keeps numbers it is 0, for its chart is final. */
ROLN_FN roln_gradient roln_gradient_of(const roln_model *md, roln_real *theta, roln_loss *loss, roln_real *windows)
{
    roln_gradient g;
    g.ae = md->ae.keeps > 0 ? NULL : theta, g.net = theta + roln_ae_params(&md->ae), g.loss = loss, g.windows = windows;
    g.signs = NULL, g.residual = NULL, g.rest = NULL, g.force_variance = NULL;
    return g;
}

/* Blocks of windows after which sums are folded. */
#define ROLNI_PARTS 64

ROLN_FN void rolni_gradient_fold(const roln_model *md, const roln_gradient *g)
{
    enum { ROLNI_TERMS = sizeof(roln_loss) / sizeof(roln_real) };
    const int ae_size = roln_ae_params(&md->ae);
    const roln_gradient *r = g->rest;
    roln_real sum[ROLNI_TERMS], rest[ROLNI_TERMS];
    if (g->ae) rolni_fold(ae_size, g->ae, r->ae);
    rolni_fold(roln_params(md) - ae_size, g->net, r->net);
    rolni_fold(1, g->windows, r->windows);
    memcpy(sum, g->loss, sizeof sum), memcpy(rest, r->loss, sizeof rest);
    rolni_fold(ROLNI_TERMS, sum, rest);
    memcpy(g->loss, sum, sizeof sum), memcpy(r->loss, rest, sizeof rest);
}

/* Nonzero if a backward is wanted, and not the loss alone. */
ROLNI_INLINE int rolni_goes_back(const roln_gradient *g)
{
    return g->ae != NULL || g->net != NULL;
}

/* A term of the loss in a block: its share f of a window's loss, its weight, where it is summed. */
typedef struct {
    roln_real f, weight, *sum;
} rolni_term;

ROLN_FN rolni_term rolni_term_of(roln_real f, roln_real weight, roln_real *sum)
{
    rolni_term t;
    t.f = f, t.weight = weight, t.sum = sum;
    return t;
}

/* One loss term of a row, c = sqrt(f weight): residual -= c xi . (a - b), ga += c xi, gb -= c xi. */
ROLN_FN void rolni_project(const roln_gradient *g, rolni_term t, int n, const roln_real *a, const roln_real *b, roln_real *ga,
                           roln_real *gb)
{
    const roln_real c = ROLN_SQRT(t.f * t.weight);
    uint64_t bits = 0;
    int i;
    for (i = 0; i < n && t.weight > 0; i++, bits >>= 1) {
        roln_real x;
        if (i % 64 == 0) bits = roln_rand(g->signs);
        x = bits & 1 ? c : -c;
        *g->residual -= x * (a[i] - b[i]);
        ga[i] += x;
        if (gb) gb[i] -= x;
    }
}

/* One loss term: *sum += f |a - b|^2, and with its weight the cotangents ga += 2 f weight (a - b), gb -= the same (gb
   may be NULL). */
ROLN_FN void rolni_compare(const roln_gradient *g, rolni_term t, int n, const roln_real *a, const roln_real *b, roln_real *ga,
                           roln_real *gb)
{
    enum { ROLNI_PART = 64 }; /* the sum of squares is taken in parts, each in order 2 */
    roln_real d[ROLNI_PART], sum = 0;
    int i, j;
    if (g->signs) {
        rolni_project(g, t, n, a, b, ga, gb);
        return;
    }
    for (i = 0; i < n; i += ROLNI_PART) {
        const int m = n - i < ROLNI_PART ? n - i : ROLNI_PART;
        for (j = 0; j < m; j++) {
            const roln_real x = 2 * t.f * t.weight * (d[j] = a[i + j] - b[i + j]);
            ga[i + j] += x;
            if (gb) gb[i + j] -= x;
        }
        sum += roln_dot(m, d, d);
    }
    *t.sum += t.f * sum;
}

/* x [rows][n] over the root of variance [n]. NULL: x stays as it is. */
ROLN_FN void rolni_divide_deviation(int rows, int n, const roln_real *variance, roln_real *x)
{
    int i, j;
    for (j = 0; variance && j < n; j++) {
        const roln_real deviation = ROLN_SQRT(variance[j]);
        for (i = 0; i < rows; i++)
            x[i * n + j] /= deviation;
    }
}

/* b [nb][n]: of each angle those of its turns that are next to a [nb][n]; all else stays. */
ROLNI_INLINE void rolni_next_to(const roln_lnn *f, int nb, const roln_real *a, roln_real *b)
{
    int i;
    for (i = 0; i < nb * f->n; i++)
        b[i] = roln_lnn_near(f, i % f->n, a[i], b[i]);
}

/* Windows w0 .. w0 + nb - 1 of a batch. */
typedef struct {
    int w0, nb;
} rolni_part;

ROLN_FN rolni_part rolni_part_of(const roln_batch *batch, int w0, int nb)
{
    rolni_part part;
    part.w0 = w0, part.nb = ROLN_MIN(nb, batch->count - w0);
    return part;
}

/* qbar of the angles of q [count][n]: eight times the mean of the turns next to the last one, the first one is the first sample. */
ROLN_FN void rolni_mean_angles(const roln_lnn *f, int count, const roln_real *q, roln_real *qbar)
{
    int i, k, pass;
    for (i = 0; i < f->n; i++) {
        if (!roln_lnn_angle(f, i)) continue;
        qbar[i] = ROLN_ABS(q[i]) > 4 * ROLNI_PI ? roln_wrap(q[i]) : q[i];
        for (pass = 0; pass < 8; pass++) {
            double off = 0;
            for (k = 0; k < count; k++) {
                const roln_real at = q[ROLNI_AS(size_t, k) * ROLNI_AS(size_t, f->n) + ROLNI_AS(size_t, i)];
                off += ROLNI_AS(double, roln_wrap(at - qbar[i]));
            }
            qbar[i] += ROLNI_AS(roln_real, off / count);
        }
    }
}

/* Sums over recordings are double, or have what they lose by rounding beside them (rolni_fold): ten million samples added in float
   are rounding errors (held by test_sums.c). Of x[k N], k < rows: the mean of what is beyond x[0], and the mean square of what is
   beyond from + mid. */
ROLN_FN double rolni_mean(size_t rows, size_t N, const roln_real *x)
{
    double sum = 0;
    size_t k;
    for (k = 0; k < rows; k++)
        sum += (ROLNI_AS(double, x[k * N]) - ROLNI_AS(double, x[0])) / ROLNI_AS(double, rows);
    return sum;
}

ROLN_FN double rolni_mean_square(size_t rows, size_t N, const roln_real *x, roln_real from, double mid)
{
    double sum = 0;
    size_t k;
    for (k = 0; k < rows; k++) {
        const double off = ROLNI_AS(double, x[k * N]) - ROLNI_AS(double, from) - mid;
        sum += off * off / ROLNI_AS(double, rows);
    }
    return sum;
}

/* each_j = rms of q_j about its mean over q [count][N]; 1 of angles, of joints that rest but for rounding, and where it is not
   finite. */
ROLN_FN void rolni_fit_each(const roln_model *md, int count, const roln_real *q, roln_real *each)
{
    const size_t N = ROLNI_AS(size_t, md->ae.size[0]), rows = ROLNI_AS(size_t, count);
    const double rest = 64 * ROLNI_AS(double, ROLN_EPS);
    size_t i;
    for (i = 0; i < N; i++) {
        const double first = ROLNI_AS(double, q[i]), sq = rolni_mean_square(rows, N, q + i, q[i], rolni_mean(rows, N, q + i));
        const roln_real own = sq > rest * rest * first * first ? ROLN_SQRT(ROLNI_AS(roln_real, sq)) : 0;
        each[i] = own > 0 && roln_finite(own) && !roln_lnn_angle(&md->lnn, ROLNI_AS(int, i)) ? own : 1;
    }
}

/* Scales that bring the data to order one: scale.q^2 = mean |q - qbar|^2 / n, scale.t = scale.q / rms(qd) likewise. Of a model with
   own units first each_j = rms(q_j - qbar_j), 1 of a joint at rest, and the scales are those of q_j / each_j, qd_j / each_j. With
   angles scale.q = 1, their each is 1, and their qbar is the mean of the turns that are next to it, found from the first sample on.
   q, qd [count][N] in; qbar [N], sc and, of a model with own units, each [N] out, else NULL. ROLN_E_LENGTH: count below 1.
   ROLN_E_NOT_FINITE (also for data at rest) leaves sc untouched, not qbar and each. */
ROLN_FN roln_status roln_fit_scale(const roln_model *md, int count, const roln_real *q, const roln_real *qd, roln_real *qbar,
                                   roln_scale *sc, roln_real *each)
{
    const size_t N = ROLNI_AS(size_t, md->ae.size[0]), rows = ROLNI_AS(size_t, count);
    double sq = 0, sv = 0;
    roln_real scale, time;
    size_t i;
    if (count < 1) return ROLN_E_LENGTH;
    for (i = 0; i < N; i++)
        qbar[i] = ROLNI_AS(roln_real, ROLNI_AS(double, q[i]) + rolni_mean(rows, N, q + i));
    if (md->lnn.angles) rolni_mean_angles(&md->lnn, count, q, qbar);
    if (each) rolni_fit_each(md, count, q, each);
    for (i = 0; i < N; i++) {
        const double unit = each ? ROLNI_AS(double, each[i]) : 1;
        sq += rolni_mean_square(rows, N, q + i, qbar[i], 0) / (unit * unit);
        sv += rolni_mean_square(rows, N, qd + i, 0, 0) / (unit * unit);
    }
    if (md->lnn.angles && sq > 0) sq = md->lnn.n;
    scale = ROLN_SQRT(ROLNI_AS(roln_real, sq / md->lnn.n));
    time = ROLN_SQRT(ROLNI_AS(roln_real, sq / sv));
    if (!roln_finite(scale) || !roln_finite(time) || !(scale > 0) || !(time > 0)) return ROLN_E_NOT_FINITE;
    sc->q = scale, sc->t = time, sc->m = 1;
    return ROLN_OK;
}

/* a /= b, term by term. */
ROLN_FN void roln_loss_divide(roln_loss *a, const roln_loss *b)
{
    a->q /= b->q, a->qd /= b->qd, a->qdd /= b->qdd;
    a->z /= b->z, a->zd /= b->zd, a->zdd /= b->zdd;
    a->q_pred /= b->q_pred, a->qd_pred /= b->qd_pred, a->qdd_pred /= b->qdd_pred;
    a->force /= b->force;
}

/* Deviation of the noise of each joint, q_each [N], from fourth differences of the positions, which motion that is slow beside dt
   hardly has: their variance is 70 times that of white noise. */
ROLN_FN void rolni_noise_of_joints(const roln_model *md, const roln_batch *b, roln_real *q_each)
{
    static const roln_real part[5] = {1, -4, 6, -4, 1};
    const int N = md->ae.size[0];
    int w, h, i, k;
    for (i = 0; i < N; i++) {
        double sum = 0, count = 0;
        for (w = 0; w < b->count; w++)
            for (h = 2; h <= b->steps - 2; h++) {
                const roln_real *const y = b->q + rolni_sample(b, w, h) * ROLNI_AS(size_t, N) + i;
                roln_real d = 0;
                for (k = -2; k <= 2; k++)
                    d += part[k + 2] * (roln_lnn_near(&md->lnn, i, *y, y[k * N]) - *y);
                if (!roln_finite(d)) continue;
                count += 1;
                sum += ROLNI_AS(double, d) * ROLNI_AS(double, d) / 70;
            }
        q_each[i] = ROLN_SQRT(ROLNI_AS(roln_real, sum / count));
    }
}

/* Sums over windows at one horizon: E_q = sqrt(q / q_var), E_qd = sqrt(qd / qd_var), of one joint or of all; of all in units of q
   where joints have the same unit, else in parts of their own. Double, for windows may be many. */
typedef struct {
    double q, q_var;   /* |q_pred - q|^2, |q - qbar|^2 */
    double qd, qd_var; /* |qd_pred - qd|^2, |qd|^2 */
} roln_error;

/* Output of NAME_errors, at steps / every + 1 horizons. joints, windows NULL: not wanted. */
typedef struct {
    roln_error *all;     /* [horizons]; sums over all windows */
    roln_error *joints;  /* [horizons][N]; the same of each joint */
    roln_error *windows; /* [horizons][count]; of each window */
} roln_errors;

/* All numbers of e [count] are finite, as roln_real, too. */
ROLN_FN int rolni_errors_finite(size_t count, const roln_error *e)
{
    size_t i;
    int bad = 0;
    for (i = 0; i < count; i++) {
        bad |= !roln_finite(ROLNI_AS(roln_real, e[i].q)), bad |= !roln_finite(ROLNI_AS(roln_real, e[i].q_var));
        bad |= !roln_finite(ROLNI_AS(roln_real, e[i].qd)), bad |= !roln_finite(ROLNI_AS(roln_real, e[i].qd_var));
    }
    return !bad;
}

/* Adds squares to a sum. */
ROLN_FN void rolni_error_add(roln_real d, roln_real c, roln_real dv, roln_real v, roln_error *e)
{
    e->q += ROLNI_AS(double, d * d);
    e->q_var += ROLNI_AS(double, c * c);
    e->qd += ROLNI_AS(double, dv * dv);
    e->qd_var += ROLNI_AS(double, v * v);
}

/* An error of variance 1 whose correlation falls with time: ends, that of its values at both ends of a step; mean, that of either
   value with the mean over the step; means, the variance of this mean. */
typedef struct { roln_real ends, mean, means; } rolni_alikeness;

/* Correlations exp(-t / lasts) over a step of u times this time:
       ends = exp(-u),   mean = (1 - ends) / u,   means = 2 (1 - mean) / u,
   for u < 1 from the series of means, as the differences would cancel. */
ROLN_FN rolni_alikeness rolni_alike(roln_real u)
{
    rolni_alikeness x;
    int k;
    if (u < 1) {
        x.means = 1;
        for (k = 18; k > 2; k--)
            x.means = 1 - u / ROLNI_AS(roln_real, k) * x.means;
        x.mean = 1 - u / 2 * x.means;
        x.ends = 1 - u * x.mean;
    } else {
        x.ends = roln_exp(-u);
        x.mean = (1 - x.ends) / u;
        x.means = 2 * (1 - x.mean) / u;
    }
    return x;
}

enum { ROLNI_TIMES = 10 }; /* times over which errors may last, which NAME_fit_outlook tries */

/* Errors whose variance grows with novelty: always^2 + grows^2 novelty^(halves / 2). Tried are ROLNI_GROWTHS growths, halves = 2
   and on, and ROLNI_FLOORS parts that always^2 has of the sum; sums over samples of log v and of error^2 / v, v the variance but
   for its scale. */
enum { ROLNI_GROWTHS = 7, ROLNI_FLOORS = 6 };
typedef double rolni_growths[ROLNI_GROWTHS][ROLNI_FLOORS];

ROLN_FN double rolni_floor_part(int i)
{
    static const double part[ROLNI_FLOORS] = {0, 0.05, 0.2, 0.5, 0.8, 0.95};
    return part[i];
}

/* log v of a double that may be too large or too small for roln_real, or infinite, or 0. */
ROLN_FN double rolni_growth_log(double v)
{
    double log = 0;
    int i;
    for (i = 0; i < 10 && v > 1e30; i++)
        v *= 1e-30, log += 69.07755278982137; /* log 1e30 */
    for (; i < 10 && v < 1e-30; i++)
        v *= 1e30, log -= 69.07755278982137;
    return log + ROLNI_AS(double, roln_log(ROLNI_AS(roln_real, v)));
}

/* A sample of numbers: their errors at a novelty. */
ROLN_FN void rolni_growth_add(int numbers, roln_real novelty, const roln_real *error, rolni_growths logs, rolni_growths *squares)
{
    const double root = ROLNI_AS(double, ROLN_SQRT(novelty));
    double grown = root * root;
    int g, r, i;
    for (g = 0; g < ROLNI_GROWTHS; g++, grown *= root)
        for (r = 0; r < ROLNI_FLOORS; r++) {
            const double part = rolni_floor_part(r), v = part + (1 - part) * grown;
            logs[g][r] += rolni_growth_log(v);
            for (i = 0; i < numbers; i++)
                squares[i][g][r] += ROLNI_AS(double, error[i]) * ROLNI_AS(double, error[i]) / v;
        }
}

/* Of a growth the part of one number under which its errors in count samples are likeliest; adds minus twice the mean log
   likelihood, but for a constant of that number, to *cost. A number without errors says nothing, nor does a growth beyond the
   largest double. */
ROLN_FN int rolni_growth_part(int count, int g, rolni_growths logs, rolni_growths squares, double *cost)
{
    double least = 1e300;
    int r, best = 0;
    if (!(squares[0][0] > 0)) return 0;
    for (r = 0; r < ROLNI_FLOORS; r++) {
        const double here = rolni_growth_log(squares[g][r] / squares[0][0]) + logs[g][r] / count;
        if (here < least && here > -1e300) least = here, best = r;
    }
    *cost += least;
    return best;
}

/* The root of a mean square, of which the square may be too small for roln_real. */
ROLN_FN roln_real rolni_growth_root(double square)
{
    return square < 1e-20 ? ROLN_SQRT(ROLNI_AS(roln_real, square * 1e36)) * ROLN_C(1e-18) : ROLN_SQRT(ROLNI_AS(roln_real, square));
}

/* The growth under which all errors in count samples are likeliest, in halves, and always, grows [numbers]. */
ROLN_FN int rolni_growth_solve(int count, int numbers, rolni_growths logs, rolni_growths *squares, roln_real *always,
                               roln_real *grows)
{
    double least = 0;
    int g, i, best = 0;
    for (g = 0; g < ROLNI_GROWTHS; g++) {
        double cost = 0;
        for (i = 0; i < numbers; i++)
            (void)rolni_growth_part(count, g, logs, squares[i], &cost);
        if (g == 0 || cost < least) least = cost, best = g;
    }
    for (i = 0; i < numbers; i++) {
        const int r = rolni_growth_part(count, best, logs, squares[i], &least);
        const double part = rolni_floor_part(r), square = squares[i][best][r] / count;
        always[i] = rolni_growth_root(square * part);
        grows[i] = rolni_growth_root(square * (1 - part));
    }
    return best + 2;
}

/* ---- 7 packed parameters --------------------------------------------------------------------- */

/* Layout, little-endian: "ROLN", u16 format, u8 bytes per number, u8 number of sizes; the sizes, u16 each (rolni_pack_head);
   the numbers of NAME_params in their order: slope, eigenvalue_floor, scale.q, scale.t, scale.m, each [N] of a model with own
   units, dt, z_min [n], z_max [n], zd_max [n], theta, of which weights stored small are words; u64 FNV-1a of all before. The last
   sizes are of what not every model has, in this order: two are the bits of angles; one the number of driven joints; two the
   degrees of the polynomials of M and of V; one the columns of squares. In the macros each is the number of own units, N or 0. The
   functions of this section take the numbers of NAME_params through a pointer to the whole and copy them as bytes. */
#define ROLN_FORMAT 3
#define ROLN_FORMAT_ACTUATOR 4    /* of models with actuators or driven joints, which older versions of roln refuse */
#define ROLN_FORMAT_POLYNOMIALS 5 /* of models with polynomials or squares, likewise */
#define ROLNI_FORMAT(actuator, driven, degree, squares) \
    ((degree) > 0 || (squares) > 0 ? ROLN_FORMAT_POLYNOMIALS : (actuator) > 0 || (driven) > 0 ? ROLN_FORMAT_ACTUATOR : ROLN_FORMAT)
#define ROLN_NUMBERS(each, n, params) (6 + (each) + 3 * (n) + (params)) /* of NAME_params */
#define ROLN_SIZES(ae_layers, mlp_layers, layers, angles, driven, degree, squares) \
    (8 + (ae_layers) + (mlp_layers) + 2 * (layers) + 2 * ((angles) > 0) + ((driven) > 0) + 2 * ((degree) > 0) + ((squares) > 0))
#define ROLN_PACKED(sizes, each, n, params) \
    (8 + 2 * (sizes) + ROLNI_AS(int, sizeof(roln_real)) * ROLN_NUMBERS(each, n, params) + 8)

/* FNV-1a (64 bit) of count bytes, carried on from h; start with ROLN_FNV. */
#define ROLN_FNV UINT64_C(0xcbf29ce484222325)
ROLN_FN uint64_t roln_fnv(int count, const unsigned char *bytes, uint64_t h)
{
    int i;
    for (i = 0; i < count; i++)
        h = (h ^ bytes[i]) * UINT64_C(0x100000001b3);
    return h;
}

/* A checksum of count numbers, carried on from sum, which costs less than FNV-1a. */
ROLN_FN roln_bits rolni_mark(int count, const roln_real *x, roln_bits sum)
{
    int i;
    for (i = 0; i < count; i++)
        sum = ((sum << 5 | sum >> (8 * sizeof sum - 5)) ^ rolni_bits(x[i])) * 16777619;
    return sum;
}

/* CRC-32 (zlib, Ethernet: 0xedb88320 reflected) of count numbers at p, each as its bytes from the least significant one on,
   carried on from crc; start with 0. The same on every machine, and on little-endian ones that of the bytes as they lie in memory.
   Eight steps of four bits for 32, without a loop: 64 bytes of table, on a Cortex-M4F 7.5 instructions a byte. */
#define ROLNI_CRC_4 (crc = table[crc & 15] ^ (crc >> 4))
ROLN_FN uint32_t roln_crc(int count, const unsigned char *p, uint32_t crc)
{
    static const uint32_t table[16] = {
        UINT32_C(0x00000000), UINT32_C(0x1db71064), UINT32_C(0x3b6e20c8), UINT32_C(0x26d930ac),
        UINT32_C(0x76dc4190), UINT32_C(0x6b6b51f4), UINT32_C(0x4db26158), UINT32_C(0x5005713c),
        UINT32_C(0xedb88320), UINT32_C(0xf00f9344), UINT32_C(0xd6d6a3e8), UINT32_C(0xcb61b38c),
        UINT32_C(0x9b64c2b0), UINT32_C(0x86d3d2d4), UINT32_C(0xa00ae278), UINT32_C(0xbdbdf21c)};
    int i, part;
    crc = ~crc;
    for (i = 0; i < count; i++) {
        roln_bits b;
        memcpy(&b, p + ROLNI_AS(size_t, i) * sizeof b, sizeof b);
        for (part = 0; part < ROLNI_AS(int, sizeof b / 4); part++) {
            crc ^= ROLNI_AS(uint32_t, (b >> (32 * part)) & UINT32_C(0xffffffff));
            ROLNI_CRC_4, ROLNI_CRC_4, ROLNI_CRC_4, ROLNI_CRC_4;
            ROLNI_CRC_4, ROLNI_CRC_4, ROLNI_CRC_4, ROLNI_CRC_4;
        }
    }
    return ~crc;
}

/* Where NAME_check stands. Zeroed: a fresh start. */
typedef struct {
    uint32_t reference; /* CRC-32 of the parameters as they should be: of the first pass, or yours, with valid = 1 */
    uint32_t sum;       /* of this pass so far */
    int valid;          /* 1: there is a reference */
    int at;             /* number that comes next; their count, once they were found to be damaged */
} roln_check;

/* Carry a pass over the size numbers at p on by count of them. ROLN_E_CHECKSUM: it has ended with another sum than the reference,
   and so on with every call until c is zeroed, or c itself is damaged. ROLN_E_LENGTH: count is below 1. */
ROLN_FN roln_status roln_check_step(int size, const void *numbers, int count, roln_check *c)
{
    const unsigned char *p = ROLNI_AS(const unsigned char *, numbers);
    if (count < 1) return ROLN_E_LENGTH;
    if (c->at < 0 || c->at >= size) return ROLN_E_CHECKSUM;
    count = ROLN_MIN(count, size - c->at);
    c->sum = roln_crc(count, p + ROLNI_AS(size_t, c->at) * sizeof(roln_bits), c->sum);
    c->at += count;
    if (c->at < size) return ROLN_OK;
    if (!c->valid) c->reference = c->sum, c->valid = 1;
    if (c->sum != c->reference) return ROLN_E_CHECKSUM;
    c->sum = 0, c->at = 0;
    return ROLN_OK;
}

ROLN_FN void rolni_put(unsigned char **p, uint64_t x, int bytes)
{
    for (; bytes > 0; bytes--, x >>= 8)
        *(*p)++ = ROLNI_AS(unsigned char, x & 255);
}

ROLN_FN uint64_t rolni_get(const unsigned char **p, int bytes)
{
    uint64_t x = 0;
    int i;
    for (i = 0; i < bytes; i++)
        x |= ROLNI_AS(uint64_t, (*p)[i]) << (8 * i);
    *p += bytes;
    return x;
}

/* The bits of number i of the numbers at p, which may lie anywhere in memory; in this machine's order of bytes. */
ROLN_FN roln_bits rolni_word_at(const unsigned char *p, int i)
{
    roln_bits b;
    memcpy(&b, p + ROLNI_AS(size_t, i) * sizeof b, sizeof b);
    return b;
}

/* The same of packed numbers. */
ROLN_FN roln_bits rolni_packed_at(const unsigned char *p, int i)
{
    p += ROLNI_AS(size_t, i) * sizeof(roln_bits);
    return ROLNI_AS(roln_bits, rolni_get(&p, ROLNI_AS(int, sizeof(roln_bits))));
}

ROLN_FN roln_real rolni_packed(const unsigned char *p, int i)
{
    return rolni_real(rolni_packed_at(p, i));
}

/* Nonzero if n bytes agree. Not memcmp, of which compilers make bcmp. */
ROLN_FN int rolni_same(int n, const unsigned char *a, const unsigned char *b)
{
    int i, differ = 0;
    for (i = 0; i < n; i++)
        differ |= a[i] ^ b[i];
    return differ == 0;
}

ROLN_FN int rolni_format(const roln_model *md)
{
    return ROLNI_FORMAT(md->actuator, md->lnn.driven, md->lnn.mass_net.degree, md->lnn.squares);
}

/* How many sizes there are. */
ROLN_FN int rolni_sizes(const roln_model *md)
{
    const roln_lnn *f = &md->lnn;
    return ROLN_SIZES(md->ae.layers, f->mass_net.layers, f->layers, f->angles, f->driven, f->mass_net.degree, f->squares);
}

/* The leading bytes: what must agree before the numbers mean anything. Returns their count. */
#define ROLNI_HEAD (8 + 2 * ROLN_SIZES(ROLN_AE_MAX, ROLN_MLP_MAX, ROLN_LAYERS_MAX, 1, 1, 1, 1))
ROLN_FN int rolni_pack_head(const roln_model *md, unsigned char *bytes)
{
    const roln_lnn *f = &md->lnn;
    unsigned char *p = bytes;
    int flags, l;
    memcpy(p, "ROLN", 4);
    p += 4;
    rolni_put(&p, ROLNI_AS(uint64_t, rolni_format(md)), 2);
    rolni_put(&p, sizeof(roln_real), 1);
    rolni_put(&p, ROLNI_AS(uint64_t, rolni_sizes(md)), 1);
    rolni_put(&p, ROLNI_AS(uint64_t, md->scheme), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, md->inputs), 2);
    flags = f->mass + 2 * f->base + 4 * f->damping + 8 * rolni_ae_bits(&md->ae) + 256 * md->ae.degree;
    flags += 4096 * (f->friction & 1) + 8192 * (f->friction & 2) + 8192 * md->own; /* damping 2 is bit 3, friction 2 bit 14 */
    flags += 16 * md->actuator;                                                    /* bits 4, 5 */
    flags += 32768 * (f->mass_net.degree > 0);
    rolni_put(&p, ROLNI_AS(uint64_t, flags), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, md->ae.layers), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, f->mass_net.layers), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, f->layers), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, f->n), 2);
    for (l = 0; l <= md->ae.layers; l++)
        rolni_put(&p, ROLNI_AS(uint64_t, md->ae.size[l]), 2);
    for (l = 1; l < f->mass_net.layers; l++)
        rolni_put(&p, ROLNI_AS(uint64_t, f->mass_net.size[l]), 2);
    for (l = 0; l <= f->layers; l++) /* sizes of X_0 .. X_layers, which were not always n; kinds */
        rolni_put(&p, ROLNI_AS(uint64_t, f->n), 2);
    for (l = 0; l < f->layers; l++)
        rolni_put(&p, ROLN_GYRO, 2);
    if (f->angles) rolni_put(&p, f->angles, 4);
    if (f->driven > 0) rolni_put(&p, ROLNI_AS(uint64_t, f->driven), 2);
    if (f->mass_net.degree > 0) {
        rolni_put(&p, ROLNI_AS(uint64_t, f->mass_net.degree), 2);
        rolni_put(&p, ROLNI_AS(uint64_t, f->potential_net.degree), 2);
    }
    if (f->squares > 0) rolni_put(&p, ROLNI_AS(uint64_t, f->squares), 2);
    return ROLNI_AS(int, p - bytes);
}

/* How many own units stand among the numbers of a model. */
ROLN_FN int rolni_own(const roln_model *md)
{
    return md->own ? md->ae.size[0] : 0;
}

/* Write the numbers of a model to bytes [ROLN_PACKED]. */
ROLN_FN void roln_pack(const roln_model *md, const void *numbers, unsigned char *bytes)
{
    const unsigned char *from = ROLNI_AS(const unsigned char *, numbers);
    const int count = ROLN_NUMBERS(rolni_own(md), md->lnn.n, roln_params(md)), size = ROLNI_AS(int, sizeof(roln_bits));
    unsigned char *p = bytes + rolni_pack_head(md, bytes);
    int i;
    for (i = 0; i < count; i++)
        rolni_put(&p, rolni_word_at(from, i), size);
    rolni_put(&p, roln_fnv(ROLNI_AS(int, p - bytes), bytes, ROLN_FNV), 8);
}

/* Number i of theta, which is packed at ctx. */
ROLN_FN roln_bits rolni_packed_theta(const void *ctx, int i)
{
    return rolni_packed_at(ROLNI_AS(const unsigned char *, ctx), i);
}

/* Read count bytes written by roln_pack for the same model. ROLN_E_LENGTH, ROLN_E_FORMAT (not ROLN or another format),
   ROLN_E_PRECISION, ROLN_E_SHAPE (sizes, degrees, storage, chart, mass matrix, scheme, angles, units, slope or eigenvalue_floor
   differ; scale.q or each of angles is not 1), ROLN_E_CHECKSUM, ROLN_E_NOT_FINITE (a number is not, or a scale is not positive),
   ROLN_E_RANGE (z_min > z_max, zd_max or dt negative), ROLN_E_ILL_CONDITIONED (Psi^T Phi is not I: no left inverse): numbers is
   untouched. */
ROLN_FN roln_status roln_unpack(const roln_model *md, int count, const unsigned char *bytes, void *numbers)
{
    const int n = md->lnn.n, own = rolni_own(md), params = roln_params(md), at = ROLN_NUMBERS(own, n, 0); /* of theta[0] */
    unsigned char head[ROLNI_HEAD];
    const int lead = rolni_pack_head(md, head);
    const int total = ROLN_PACKED(rolni_sizes(md), own, n, params);
    const unsigned char *p, *sum;
    int i;
    if (count < 8) return ROLN_E_LENGTH;
    if (!rolni_same(6, bytes, head)) return ROLN_E_FORMAT;
    if (bytes[6] != head[6]) return ROLN_E_PRECISION;
    if (count < lead) return ROLN_E_LENGTH;
    if (!rolni_same(lead, bytes, head)) return ROLN_E_SHAPE;
    if (count != total) return ROLN_E_LENGTH;
    sum = bytes + total - 8;
    if (rolni_get(&sum, 8) != roln_fnv(total - 8, bytes, ROLN_FNV)) return ROLN_E_CHECKSUM;
    p = bytes + lead;
    if (rolni_packed_at(p, 0) != rolni_bits(md->ae.slope)) return ROLN_E_SHAPE;
    if (rolni_packed_at(p, 1) != rolni_bits(md->lnn.eigenvalue_floor)) return ROLN_E_SHAPE;
    for (i = 0; i < at + params; i++)
        if ((i < at || roln_ae_is_number(&md->ae, i - at)) && !roln_finite(rolni_packed(p, i))) return ROLN_E_NOT_FINITE;
    for (i = 2; i < 5 + own; i++)
        if (!(rolni_packed(p, i) > 0)) return ROLN_E_NOT_FINITE;
    if (md->lnn.angles && rolni_packed_at(p, 2) != rolni_bits(1)) return ROLN_E_SHAPE;
    for (i = 0; i < own; i++)
        if (roln_lnn_angle(&md->lnn, i) && rolni_packed_at(p, 5 + i) != rolni_bits(1)) return ROLN_E_SHAPE;
    if (rolni_packed(p, 5 + own) < 0) return ROLN_E_RANGE;
    for (i = 6 + own; i < 6 + own + n; i++)
        if (rolni_packed(p, i) > rolni_packed(p, i + n) || rolni_packed(p, i + 2 * n) < 0) return ROLN_E_RANGE;
    {
        const roln_status st = rolni_ae_check(&md->ae, rolni_packed_theta, p + ROLNI_AS(size_t, at) * sizeof(roln_real));
        if (st != ROLN_OK) return st;
    }
    for (i = 0; i < at + params; i++) {
        const roln_bits b = rolni_packed_at(p, i);
        memcpy(ROLNI_AS(unsigned char *, numbers) + ROLNI_AS(size_t, i) * sizeof b, &b, sizeof b);
    }
    return ROLN_OK;
}

/* Text of a C initialiser goes out through put(ctx, text), piece by piece; every number is written exactly, as an
   integer over a power of two. */
typedef void (*roln_put)(void *ctx, const char *text);

ROLN_FN void rolni_write_integer(uint64_t x, const char *then, roln_put put, void *ctx)
{
    char text[24];
    int at = 23;
    text[at] = 0;
    do text[--at] = ROLNI_AS(char, '0' + x % 10);
    while ((x /= 10) != 0);
    put(ctx, text + at);
    put(ctx, then);
}

ROLN_FN void rolni_write_real(roln_real x, roln_put put, void *ctx)
{
#ifdef ROLN_DOUBLE
    const int mant = 52;
#else
    const int mant = 23;
#endif
    const char *const point = sizeof(roln_real) == 4 ? ".f" : ".";
    const roln_bits one = 1;
    roln_bits b, m;
    int e;
    memcpy(&b, &x, sizeof b);
    if (b >> (8 * sizeof b - 1)) put(ctx, "-");
    m = b & ((one << mant) - 1);
    e = ROLNI_AS(int, (b >> mant) & ((one << (8 * ROLNI_AS(int, sizeof b) - 1 - mant)) - 1));
    if (e > 0) m |= one << mant;
    e = (e > 0 ? e : 1) - (sizeof b == 4 ? 127 : 1023) - mant;
    for (; m != 0 && !(m & 1); e++)
        m >>= 1;
    rolni_write_integer(m, point, put, ctx);
    while (m != 0 && e != 0) {
        const int k = e > 0 ? (e < 60 ? e : 60) : (e > -60 ? -e : 60);
        put(ctx, e > 0 ? "*" : "/");
        rolni_write_integer(UINT64_C(1) << k, point, put, ctx);
        e += e > 0 ? -k : k;
    }
}

/* Numbers from .. from + n - 1 of p as a list, and what follows it. */
ROLN_FN void rolni_write_reals(int from, int n, const unsigned char *p, const char *then, roln_put put, void *ctx)
{
    int i;
    for (i = 0; i < n; i++) {
        if (i > 0) put(ctx, i % 8 ? ", " : ",\n    ");
        rolni_write_real(rolni_real(rolni_word_at(p, from + i)), put, ctx);
    }
    put(ctx, then);
}

/* Their bits as words. */
ROLN_FN void rolni_write_words(int n, const unsigned char *p, roln_put put, void *ctx)
{
    int i, k;
    for (i = 0; i < n; i++) {
        char text[] = "0x00000000,";
        roln_bits b = rolni_word_at(p, i);
        for (k = 9; k >= 2; k--, b >>= 4)
            text[k] = "0123456789abcdef"[b & 15];
        put(ctx, i % 8 ? " " : "\n    ");
        put(ctx, text);
    }
}

/* Where text goes, and the name of the model in it. */
typedef struct {
    const char *name;
    roln_put put;
    void *ctx;
} rolni_text;

/* before NAME_what after */
ROLN_FN void rolni_write_name(const rolni_text *t, const char *before, const char *what, const char *after)
{
    t->put(t->ctx, before);
    t->put(t->ctx, t->name);
    t->put(t->ctx, "_");
    t->put(t->ctx, what);
    t->put(t->ctx, after);
}

/* A type that is one only where the enumerators NAME_size[] [count] are value[]. The compiler's complaint names the option as it
   must be, in words if it is given in words: NAME_weights_are_of_ROLN_AE_16_4. */
ROLN_FN void rolni_write_need(const rolni_text *t, const char *option, int count, const char *const *size, const char *const *word,
                              const int *value)
{
    int i, said = count;
    for (; said > 1 && value[said - 1] == 0;)
        said--;
    rolni_write_name(t, "typedef char ", "weights_are_of_ROLN_", option);
    for (i = 0; i < said; i++) {
        t->put(t->ctx, "_");
        if (word != NULL) t->put(t->ctx, word[value[i]]);
        else rolni_write_integer(ROLNI_AS(uint64_t, value[i]), "", t->put, t->ctx);
    }
    for (i = 0; i < count; i++) {
        rolni_write_name(t, i > 0 ? " && " : "[", size[i], " == ");
        rolni_write_integer(ROLNI_AS(uint64_t, value[i]), "", t->put, t->ctx);
    }
    t->put(t->ctx, " ? 1 : -1];\n");
}

/* ANGLES_1_0_bits, before the number that is these bits; ANGLES without angles. */
#define ROLNI_ANGLES_TEXT (12 + 2 * ROLN_ANGLES_MAX)
ROLN_FN const char *rolni_angles_text(const roln_lnn *f, char *text)
{
    char *p = text + 6;
    int i;
    memcpy(text, "ANGLES", sizeof "ANGLES");
    if (f->angles == 0) return text;
    for (i = 0; i < f->n; i++) {
        *p++ = '_';
        *p++ = roln_lnn_angle(f, i) ? '1' : '0';
    }
    memcpy(p, "_bits", sizeof "_bits");
    return text;
}

/* One for every option that C can compare where the text is compiled, and for the format. Slope and eigenvalue_floor are real. */
ROLN_FN void rolni_write_needs(const rolni_text *t, const roln_model *md)
{
    static const char *const scheme[] = {"", "euler", "rk4", "midpoint", "leapfrog"}, *const mass[] = {"exponential", "cholesky"};
    static const char *const store[] = {"full", "int8", "half"}, *const layer[] = {"0", "gyro"};
    static const char *const sizes[] = {"N", "N1", "N2", "N3", "N4", "N5", "N6", "N7", "N8"};
    static const char *const widths[] = {"H1", "H2", "H3", "H4", "H5"}, *const layers[] = {"L0", "L1", "L2", "L3"};
    static const char *const others[] = {"scheme", "degree", "cholesky", "base", "damping", "inputs", "stored", "twice", "angles",
                                         "friction", "own", "format", "actuator", "driven"};
    static const char *const unit[] = {"common", "each"}, *const actuator[] = {"torque", "current", "servo"};
    static const char *const degrees[] = {"degree_m", "degree_v"}, *const heads[] = {"cholesky", "squares"};
    const roln_lnn *f = &md->lnn;
    const int stored = rolni_ae_bits(&md->ae) / 8, twice = sizeof(roln_real) == 8;
    const int degree[2] = {f->mass_net.degree, f->potential_net.degree}, head[2] = {f->mass, f->squares};
    int other[14], hidden[ROLN_MLP_MAX - 1] = {0}, kind[ROLN_LAYERS_MAX] = {0}, l;
    char angles[ROLNI_ANGLES_TEXT];
    other[0] = md->scheme, other[1] = md->ae.degree, other[2] = f->mass, other[3] = f->base, other[4] = f->damping;
    other[5] = md->inputs, other[6] = stored, other[7] = twice, other[8] = ROLNI_AS(int, f->angles);
    other[9] = f->friction, other[10] = md->own, other[11] = rolni_format(md), other[12] = md->actuator, other[13] = f->driven;
    for (l = 1; l < f->mass_net.layers; l++)
        hidden[l - 1] = f->mass_net.size[l];
    for (l = 0; l < f->layers; l++)
        kind[l] = ROLN_GYRO;
    rolni_write_need(t, "AE", ROLN_AE_MAX + 1, sizes, NULL, md->ae.size);
    if (degree[0] > 0) rolni_write_need(t, "POLYNOMIALS", 2, degrees, NULL, degree);
    else rolni_write_need(t, "MLP", ROLN_MLP_MAX - 1, widths, NULL, hidden);
    rolni_write_need(t, "INTEGRATOR", 1, others, scheme, other);
    rolni_write_need(t, md->ae.degree > 0 ? "CHART_polynomial" : "CHART_none", 1, others + 1, NULL, other + 1);
    if (f->squares > 0) rolni_write_need(t, "MASS_squares", 1, heads + 1, NULL, head + 1);
    else rolni_write_need(t, "MASS", degree[0] > 0 ? 2 : 1, heads, mass, head); /* squares are cholesky, too, and of format 5 */
    rolni_write_need(t, "BASE", 1, others + 3, NULL, other + 3);
    rolni_write_need(t, "LAYERS", ROLN_LAYERS_MAX, layers, layer, kind);
    rolni_write_need(t, "DAMPING", 1, others + 4, NULL, other + 4);
    rolni_write_need(t, "FRICTION", 1, others + 9, NULL, other + 9);
    rolni_write_need(t, rolni_angles_text(f, angles), 1, others + 8, NULL, other + 8);
    rolni_write_need(t, "SCALE", 1, others + 10, unit, other + 10);
    rolni_write_need(t, "INPUTS", 1, others + 5, NULL, other + 5);
    if (md->actuator != ROLN_TORQUE) rolni_write_need(t, "ACTUATOR", 1, others + 12, actuator, other + 12);
    if (f->driven > 0) rolni_write_need(t, "DRIVEN", 1, others + 13, NULL, other + 13);
    rolni_write_need(t, "QUANTISE", 1, others + 6, store, other + 6);
    rolni_write_need(t, twice ? "DOUBLE_defined" : "DOUBLE_not_defined", 1, others + 7, NULL, other + 7);
    rolni_write_need(t, "FORMAT", 1, others + 11, NULL, other + 11);
}

/* Declarations of what, `static` or, with ROLN_WEIGHTS_EXTERN, extern; behind them comes the initialiser. */
ROLN_FN void rolni_write_linkage(const rolni_text *t, const char *type, const char *what)
{
    static const char *const before[] = {"#ifndef ROLN_WEIGHTS_EXTERN\nROLN_FLASH static const ", "#else\nROLN_FLASH extern const ",
                                         "#ifdef ROLN_WEIGHTS_HERE\nROLN_FLASH const "};
    static const char *const after[] = {" =\n", ";\n", " =\n#endif\n#endif\n"};
    int i;
    for (i = 0; i < 3; i++) {
        rolni_write_name(t, before[i], type, " ");
        rolni_write_name(t, "", what, after[i]);
    }
    t->put(t->ctx, "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n    ");
}

/* The definition `static const NAME_params NAME_weights = {...};` for flash, with stored weights all of it as words, which are no
   numbers to write; in front of it what makes the compiler refuse another config. ROLN_E_SHAPE: the numbers are of another slope or
   eigenvalue_floor, or of a model with angles of which scale.q or each is not 1; ROLN_E_NOT_FINITE. Nothing is put then. */
ROLN_FN roln_status roln_write(const roln_model *md, const char *name, const void *numbers, roln_put put, void *ctx)
{
    const unsigned char *p = ROLNI_AS(const unsigned char *, numbers);
    const int n = md->lnn.n, own = rolni_own(md), from = 6 + own, at = ROLN_NUMBERS(own, n, 0), count = at + roln_params(md);
    const int words = rolni_ae_bits(&md->ae) > 0;
    const rolni_text text = {name, put, ctx}, *const t = &text;
    int i;
    if (rolni_word_at(p, 0) != rolni_bits(md->ae.slope)) return ROLN_E_SHAPE;
    if (rolni_word_at(p, 1) != rolni_bits(md->lnn.eigenvalue_floor)) return ROLN_E_SHAPE;
    if (md->lnn.angles && rolni_word_at(p, 2) != rolni_bits(1)) return ROLN_E_SHAPE;
    for (i = 0; i < own; i++)
        if (roln_lnn_angle(&md->lnn, i) && rolni_word_at(p, 5 + i) != rolni_bits(1)) return ROLN_E_SHAPE;
    for (i = 0; i < count; i++)
        if ((i < at || roln_ae_is_number(&md->ae, i - at)) && !roln_finite(rolni_real(rolni_word_at(p, i))))
            return ROLN_E_NOT_FINITE;
    rolni_write_name(t, "/* Include it behind the header of the config. With ROLN_WEIGHTS_EXTERN defined ", "weights",
                     " is only declared here;\n   the one file of the program that defines ROLN_WEIGHTS_HERE, too, has it. */\n");
    put(ctx, "#ifndef ROLN_H\n#error \"include the header of the config, ");
    put(ctx, name);
    put(ctx, ".h, first\"\n#endif\n");
    rolni_write_name(t, "#ifndef ", "weights_h\n", "");
    rolni_write_name(t, "#define ", "weights_h\n", "");
    rolni_write_needs(t, md);
    rolni_write_linkage(t, words ? "words" : "params", words ? "flash" : "weights");
    if (words) {
        put(ctx, "{{");
        rolni_write_words(count, p, put, ctx);
        put(ctx, "\n}};\n#endif\n");
        rolni_write_name(t, "#define ", "weights ", "");
        rolni_write_name(t, "", "flash.params\n#endif\n", "");
        return ROLN_OK;
    }
    put(ctx, "{");
    rolni_write_reals(0, 2, p, ",\n    {", put, ctx);
    rolni_write_reals(2, 3, p, "},\n    ", put, ctx);
    if (own > 0) {
        put(ctx, "{");
        rolni_write_reals(5, own, p, "},\n    ", put, ctx);
    }
    rolni_write_reals(5 + own, 1, p, ",\n    {", put, ctx);
    rolni_write_reals(from, n, p, "},\n    {", put, ctx);
    rolni_write_reals(from + n, n, p, "},\n    {", put, ctx);
    rolni_write_reals(from + 2 * n, n, p, "},\n    {", put, ctx);
    rolni_write_reals(at, count - at, p, "}};\n#endif\n#endif\n", put, ctx);
    return ROLN_OK;
}

/* ---- 8 from a config to sizes ---------------------------------------------------------------- */

#define ROLNI_P0(a, ...) a
#define ROLNI_P1(a, b, ...) b
#define ROLNI_P2(a, b, c, ...) c
#define ROLNI_P3(a, b, c, d, ...) d
#define ROLNI_P4(a, b, c, d, e, ...) e
#define ROLNI_P5(a, b, c, d, e, f, ...) f
#define ROLNI_P6(a, b, c, d, e, f, g, ...) g
#define ROLNI_P7(a, b, c, d, e, f, g, h, ...) h
#define ROLNI_P8(a, b, c, d, e, f, g, h, i, ...) i
#define ROLNI_P9(a, b, c, d, e, f, g, h, i, j, ...) j
/* Number i of a list, 0 behind its end. */
#define ROLNI_AT(i, ...) ROLNI_P##i(__VA_ARGS__, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0)
/* Nonzero if number i of a list is at least 1 or behind its end. */
#define ROLNI_GIVEN(i, ...) (ROLNI_P##i(__VA_ARGS__, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1) >= 1)
/* Of a list of at most 31 numbers the sum of F(number, its place), and how many there are. */
#define ROLNI_TOTAL_(F, a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, A, B, C, D, E, ...) \
    (F(a, 0) + F(b, 1) + F(c, 2) + F(d, 3) + F(e, 4) + F(f, 5) + F(g, 6) + F(h, 7) + \
     F(i, 8) + F(j, 9) + F(k, 10) + F(l, 11) + F(m, 12) + F(n, 13) + F(o, 14) + F(p, 15) + \
     F(q, 16) + F(r, 17) + F(s, 18) + F(t, 19) + F(u, 20) + F(v, 21) + F(w, 22) + F(x, 23) + \
     F(y, 24) + F(z, 25) + F(A, 26) + F(B, 27) + F(C, 28) + F(D, 29) + F(E, 30))
#define ROLNI_ZEROS 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0
#define ROLNI_TOTAL(F, ...) ROLNI_TOTAL__(F, __VA_ARGS__, ROLNI_ZEROS)
#define ROLNI_TOTAL__(...) ROLNI_TOTAL_(__VA_ARGS__)
#define ROLNI_COUNT_(a, b, c, d, e, f, g, h, i, j, k, l, m, n, o, p, q, r, s, t, u, v, w, x, y, z, A, B, C, D, E, count, ...) count
#define ROLNI_COUNT__(...) ROLNI_COUNT_(__VA_ARGS__)
#define ROLNI_COUNT(...) \
    ROLNI_COUNT__(__VA_ARGS__, 31, 30, 29, 28, 27, 26, 25, 24, 23, 22, 21, 20, 19, 18, 17, 16, 15, 14, 13, 12, 11, 10, 9, 8, 7, 6, \
                  5, 4, 3, 2, 1, 0)
#define ROLNI_BIT(x, place) ((x) != 0 ? 1 << (place) : 0)
#define ROLNI_ONE(x, place) ((x) != 0)
#define ROLNI_NO_BIT(x, place) ((x) < 0 || (x) > 1)
#define ROLNI_CAT_(a, b) a##_##b
#define ROLNI_CAT(a, b) ROLNI_CAT_(a, b)
#define ROLNI_STR_(a) #a
#define ROLNI_STR(a) ROLNI_STR_(a)
#define ROLNI_SCHEME_euler ROLN_EULER
#define ROLNI_SCHEME_rk4 ROLN_RK4
#define ROLNI_SCHEME_midpoint ROLN_MIDPOINT
#define ROLNI_SCHEME_leapfrog ROLN_LEAPFROG
#define ROLNI_SCHEME(s) ROLNI_CAT(ROLNI_SCHEME, s)
#define ROLNI_FILTER_model 0
#define ROLNI_FILTER_leapfrog 1
#define ROLNI_FILTER(s) ROLNI_CAT(ROLNI_FILTER, s)
#define ROLNI_MASS_exponential ROLN_EXPONENTIAL
#define ROLNI_MASS_cholesky ROLN_CHOLESKY
#define ROLNI_MASS_squares ROLN_CHOLESKY
#define ROLNI_MASS_KIND(s) ROLNI_CAT(ROLNI_MASS, s)
#define ROLNI_SQUARES_exponential 0
#define ROLNI_SQUARES_cholesky 0
#define ROLNI_SQUARES_squares 1
#define ROLNI_SQUARES(s) ROLNI_CAT(ROLNI_SQUARES, s)
#define ROLNI_KIND_0 0
#define ROLNI_KIND_gyro ROLN_GYRO
#define ROLNI_KIND(s) ROLNI_CAT(ROLNI_KIND, s)
#define ROLNI_STORE_full ROLN_FULL
#define ROLNI_STORE_half &roln_half
#define ROLNI_STORE_int8 &roln_int8
#define ROLNI_STORE(s) ROLNI_CAT(ROLNI_STORE, s)
#define ROLNI_BITS_full 0
#define ROLNI_BITS_half 16
#define ROLNI_BITS_int8 8
#define ROLNI_BITS(s) ROLNI_CAT(ROLNI_BITS, s)
#define ROLNI_LEARN_networks 1
#define ROLNI_LEARN_everything 0
#define ROLNI_LEARN(s) ROLNI_CAT(ROLNI_LEARN, s)
#define ROLNI_OWN_common 0
#define ROLNI_OWN_each 1
#define ROLNI_OWN(s) ROLNI_CAT(ROLNI_OWN, s)
#define ROLNI_ACTUATOR_torque 0
#define ROLNI_ACTUATOR_current 1
#define ROLNI_ACTUATOR_servo 2
#define ROLNI_ACTUATOR(s) ROLNI_CAT(ROLNI_ACTUATOR, s)
#define ROLNI_CHART_none ROLN_UNBENT
#define ROLNI_CHART_polynomial &roln_polynomial
#define ROLNI_CHART(s) ROLNI_CAT(ROLNI_CHART, s)
#define ROLNI_BENDS_none 0
#define ROLNI_BENDS_polynomial 1
#define ROLNI_BENDS(s) ROLNI_CAT(ROLNI_BENDS, s)
#define ROLNI_ROOM(count) ((count) > 0 ? (count) : 1) /* C has no arrays of length 0 */
#define ROLNI_INT(x) ((x) + 0)                         /* of an enumerator, to be compared with those of another enumeration */
/* Numbers of a force on nb states that is not its own input; of servos behind it q, qd. */
#define ROLNI_TAU(S, nb) (((S(inputs) > 0) + (S(actuator) > 0) + 2 * S(servo)) * (nb) * S(N))
/* Scratch of the derivatives of servos. */
#define ROLNI_SERVO_JAC_WORK(S) \
    (S(servo) * (2 * S(N) + 2 * S(n) + ROLN_AE_DECODE_TAPE(S, 2, 1) + ROLN_AE_DECODE_BWD_WORK(S, 2, 1)))
#define ROLNI_OR(a, b) ((a) > 0 ? (a) : (b))
#define ROLNI_BEFORE(a, b, c, other) ((c) > 0 ? (b) : (b) > 0 ? (a) : (other)) /* of the last size of a, b, c the one before it */
#define ROLN_(name) ROLNI_CAT(ROLN_NAME, name)        /* NAME_name */
#define ROLNI_(name) ROLNI_CAT(ROLN_NAME, i_##name)   /* NAME_i_name: of this header alone */
#define ROLNI_ASSERT(what, truth) typedef char ROLN_(what)[(truth) ? 1 : -1];
/* The same of real numbers, which C compares in initialisers only: 1, or an error in a line that names the macro. */
#ifdef __cplusplus
#define ROLNI_TRUE(truth) ROLNI_AS(int, sizeof(char[(truth) ? 1 : -1]))
#else
#define ROLNI_TRUE(truth) (1 / (truth))
#endif
#ifdef __TINYC__ /* takes no comparison of reals for a constant, but one of integers that are made of them */
#define ROLNI_TIMES(x, scale) ROLNI_AS(long long, (x) * (scale))
#define ROLNI_IS_ABOVE_0(x) \
    (ROLNI_TIMES(x, 1e9) > 0 || ROLNI_TIMES(x, 1e18) > 0 || ROLNI_TIMES(x, 1e27) > 0 || ROLNI_TIMES(x, 1e36) > 0)
#define ROLNI_IS_AT_MOST_1(x) (ROLNI_TIMES(x, 1e9) <= 1000000000)
#else
#define ROLNI_IS_ABOVE_0(x) ((x) > 0)
#define ROLNI_IS_AT_MOST_1(x) ((x) <= 1)
#endif
/* Factors of what is not 0: gcc takes 0 times an error for 0. */
#define ROLNI_SLOPE_IS_ABOVE_0_AND_AT_MOST_1(slope) ROLNI_TRUE(ROLNI_IS_ABOVE_0(slope) && ROLNI_IS_AT_MOST_1(slope))
#define ROLNI_EIGENVALUE_FLOOR_IS_ABOVE_0(least) ROLNI_TRUE(ROLNI_IS_ABOVE_0(ROLNI_AS(roln_real, least)))
/* F of each of the eight layers that an autoencoder may have, N -> n, n = 0 where there is none. */
#define ROLNI_EACH_LAYER(F, join) \
    F(ROLN_(N), ROLN_(N1)) join F(ROLN_(N1), ROLN_(N2)) join F(ROLN_(N2), ROLN_(N3)) join F(ROLN_(N3), ROLN_(N4)) join \
    F(ROLN_(N4), ROLN_(N5)) join F(ROLN_(N5), ROLN_(N6)) join F(ROLN_(N6), ROLN_(N7)) join F(ROLN_(N7), ROLN_(N8))
#define ROLNI_COMMA ,
/* Named constants `NAME = value, ..` between ROLNI_INTS and ROLNI_INTS_END: enumerators in C. In C++ they are const ints, because
   C++26 refuses arithmetic of an enumerator with a float or with one of another enumeration, and users multiply by NAME_N. */
#ifdef __cplusplus
#define ROLNI_INTS static const int
#define ROLNI_INTS_END
#else
#define ROLNI_INTS enum {
#define ROLNI_INTS_END }
#endif
/* Numbers of work of the hungriest manifold. */
#define ROLNI_VERB_WORK(S) \
    ROLN_MAX(S(N1) > 0 ? ROLN_BIORTH_BLOCK_WORK(S(N1), S(N)) : 0, \
             S(base) > 0 || S(layers) > 0 ? ROLN_SPD_BLOCK_WORK(S(n)) : 0)
/* Of one layer: its weights, as stored and full; second moments; what an update keeps of it; its blocks. */
#define ROLNI_LAYER(N, n) ((n) > 0 ? ROLN_AE_LAYER(ROLNI_BITS(ROLN_QUANTISE), N, n) : 0)
#define ROLNI_LAYER_FULL(N, n) ((n) > 0 ? ROLN_AE_LAYER(0, N, n) : 0)
#define ROLNI_LAYER_MOMENTS(N, n) ((n) > 0 ? 1 + (N) : 0)
#define ROLNI_LAYER_UPDATE(N, n) ((n) > 0 ? 4 * (N) * (n) + 2 : 0)
#define ROLNI_LAYER_OK(N, n) ((n) >= 0 && (n) <= (N))
#define ROLNI_LAYER_BLOCKS(N, n) {&roln_biorthogonal, n, (n) > 0 ? (N) : 0, 0}, {ROLN_EUCLIDEAN, 1, (n) > 0 ? (N) : 0, 2}
/* The blocks of one SPD layer, W and B; none where its kind is 0. */
#define ROLNI_SPD_BLOCKS(kind, n) \
    {ROLN_EUCLIDEAN, 1, (kind) > 0 ? ROLN_TRI(n) : 0, 1}, \
    {(kind) > 0 ? &roln_spd : ROLN_EUCLIDEAN, (kind) > 0 ? (n) : 0, (kind) > 0 ? (n) : 0, 1}

#endif

/* ---- 9 sizes and types of a model ------------------------------------------------------------ */

#ifdef ROLN_NAME

#include "roln_spd.h" /* asks again whether ROLN_DOUBLE is what it was */
#if defined(ROLN_STEP) || defined(ROLN_STORE) || defined(ROLN_ROWS) || defined(ROLN_LEAST)
#error "ROLN_STEP, STORE, ROWS, LEAST are ROLN_INTEGRATOR, QUANTISE, GN_ROWS, EIGENVALUE_FLOOR now: .packaging/rename.sed"
#endif
#ifndef ROLN_AE
#error "ROLN_AE: the sizes of the autoencoder, such as 16, 12, 8, 4"
#endif
#if defined ROLN_MLP && defined ROLN_POLYNOMIALS
#error "ROLN_MLP, ROLN_POLYNOMIALS: a model has one of them"
#elif !defined ROLN_MLP && !defined ROLN_POLYNOMIALS
#error "ROLN_MLP: the hidden widths of the networks, such as 64, 64; or ROLN_POLYNOMIALS: degrees, such as 4, 7"
#define ROLN_MLP 1
#endif
#ifndef ROLN_MLP
#define ROLN_MLP 0
#endif
#ifndef ROLN_POLYNOMIALS
#define ROLN_POLYNOMIALS 0
#endif
#ifndef ROLN_INTEGRATOR
#define ROLN_INTEGRATOR rk4
#endif
#ifndef ROLN_SLOPE
#define ROLN_SLOPE 0.41421356
#endif
#ifndef ROLN_CHART
#define ROLN_CHART none
#endif
#ifndef ROLN_BASE
#define ROLN_BASE 0
#endif
#ifndef ROLN_MASS
#define ROLN_MASS exponential
#endif
#ifndef ROLN_LAYERS
#define ROLN_LAYERS 0
#endif
#ifndef ROLN_EIGENVALUE_FLOOR
#define ROLN_EIGENVALUE_FLOOR 1e-4
#endif
#ifndef ROLN_DAMPING
#define ROLN_DAMPING 0
#endif
#ifndef ROLN_FRICTION
#define ROLN_FRICTION 0
#endif
#ifndef ROLN_STICTION
#define ROLN_STICTION 0
#endif
#ifndef ROLN_FILTER
#define ROLN_FILTER model
#endif
#ifndef ROLN_ANGLES
#define ROLN_ANGLES 0
#endif
#ifndef ROLN_SCALE
#define ROLN_SCALE common
#endif
#ifndef ROLN_INPUTS
#define ROLN_INPUTS 0
#endif
#ifndef ROLN_ACTUATOR
#define ROLN_ACTUATOR torque
#endif
#ifndef ROLN_DRIVEN
#define ROLN_DRIVEN 0
#endif
#ifndef ROLN_HORIZON
#define ROLN_HORIZON 8
#endif
#ifndef ROLN_BLOCK
#define ROLN_BLOCK 16
#endif
#ifndef ROLN_QUANTISE
#define ROLN_QUANTISE full
#endif
#ifndef ROLN_GN_ROWS
#define ROLN_GN_ROWS 0
#endif
#ifndef ROLN_PLAN
#define ROLN_PLAN 0
#endif
#ifndef ROLN_LEARN
#define ROLN_LEARN networks
#endif
#ifndef ROLN_DELAY
#define ROLN_DELAY 0
#endif
#ifndef ROLN_LOAD
#define ROLN_LOAD 0
#endif

/* Sizes. N, n: full and latent degrees of freedom; force_size: numbers of a force; theta_size: trained parameters; packed_size:
   bytes of NAME_pack; horizon: longest training window in steps. */
ROLNI_INTS
    ROLN_(N) = ROLNI_AT(0, ROLN_AE), ROLN_(N1) = ROLNI_AT(1, ROLN_AE), ROLN_(N2) = ROLNI_AT(2, ROLN_AE),
    ROLN_(N3) = ROLNI_AT(3, ROLN_AE), ROLN_(N4) = ROLNI_AT(4, ROLN_AE), ROLN_(N5) = ROLNI_AT(5, ROLN_AE),
    ROLN_(N6) = ROLNI_AT(6, ROLN_AE), ROLN_(N7) = ROLNI_AT(7, ROLN_AE), ROLN_(N8) = ROLNI_AT(8, ROLN_AE),
    ROLN_(ae_layers) = (ROLN_(N1) > 0) + (ROLN_(N2) > 0) + (ROLN_(N3) > 0) + (ROLN_(N4) > 0) + (ROLN_(N5) > 0) +
                     (ROLN_(N6) > 0) + (ROLN_(N7) > 0) + (ROLN_(N8) > 0),
    ROLN_(ae_sum) = ROLN_(N1) + ROLN_(N2) + ROLN_(N3) + ROLN_(N4) + ROLN_(N5) + ROLN_(N6) + ROLN_(N7) + ROLN_(N8),
    ROLN_(n4) = ROLNI_OR(ROLN_(N4), ROLNI_OR(ROLN_(N3), ROLNI_OR(ROLN_(N2), ROLNI_OR(ROLN_(N1), ROLN_(N))))),
    ROLN_(n) = ROLNI_OR(ROLN_(N8), ROLNI_OR(ROLN_(N7), ROLNI_OR(ROLN_(N6), ROLNI_OR(ROLN_(N5), ROLN_(n4))))),
    /* the bent layer: size of its input, degree and number of its polynomials */
    ROLN_(degree) = ROLNI_AT(1, ROLN_CHART),
    ROLN_(outer) = ROLNI_BEFORE(ROLN_(N6), ROLN_(N7), ROLN_(N8), ROLNI_BEFORE(ROLN_(N4), ROLN_(N5), ROLN_(N6),
                    ROLNI_BEFORE(ROLN_(N2), ROLN_(N3), ROLN_(N4), ROLNI_BEFORE(ROLN_(N), ROLN_(N1), ROLN_(N2), 0)))),
    ROLN_(bent) = ROLN_(degree) > 0 ? ROLN_(outer) : 0,
    ROLN_(monomials) = ROLN_MONOMIALS(ROLN_(n), ROLN_(degree)),
    ROLN_(ae_size) = ROLNI_EACH_LAYER(ROLNI_LAYER, +) + ROLN_(monomials) * ROLN_AE_ROW(ROLNI_BITS(ROLN_QUANTISE), ROLN_(bent)),
    ROLN_(angles) = ROLNI_TOTAL(ROLNI_BIT, ROLN_ANGLES), /* bits */
    ROLN_(cossin) = ROLN_(angles) == 0 ? 0 : ROLN_(n) + ROLNI_TOTAL(ROLNI_ONE, ROLN_ANGLES),
    ROLN_(net_inputs) = ROLNI_OR(ROLN_(cossin), ROLN_(n)), /* of the networks of M and V */
    /* perceptrons: hidden sizes, 0 of polynomials */
    ROLN_(H1) = ROLNI_AT(0, ROLN_MLP), ROLN_(H2) = ROLNI_AT(1, ROLN_MLP), ROLN_(H3) = ROLNI_AT(2, ROLN_MLP),
    ROLN_(H4) = ROLNI_AT(3, ROLN_MLP), ROLN_(H5) = ROLNI_AT(4, ROLN_MLP),
    /* polynomials: degrees; first hidden sizes of either kind; _m: of M and R, _v: of V */
    ROLN_(degree_m) = ROLNI_AT(0, ROLN_POLYNOMIALS), ROLN_(degree_v) = ROLNI_AT(1, ROLN_POLYNOMIALS),
    ROLN_(polynomials) = ROLN_(degree_m) != 0 || ROLN_(degree_v) != 0,
    ROLN_(H1_m) = ROLN_(polynomials) ? ROLN_(net_inputs) + ROLN_MONOMIALS(ROLN_(net_inputs), ROLN_(degree_m)) : ROLN_(H1),
    ROLN_(H1_v) = ROLN_(polynomials) ? ROLN_(net_inputs) + ROLN_MONOMIALS(ROLN_(net_inputs), ROLN_(degree_v)) : ROLN_(H1),
    /* sums and the most of hidden sizes; the last one; weights without the output layer */
    ROLN_(mlp_layers) = 1 + (ROLN_(H1_m) > 0) + (ROLN_(H2) > 0) + (ROLN_(H3) > 0) + (ROLN_(H4) > 0) + (ROLN_(H5) > 0),
    ROLN_(hidden) = ROLN_(H1_m) + ROLN_(H2) + ROLN_(H3) + ROLN_(H4) + ROLN_(H5),
    ROLN_(hidden_v) = ROLN_(H1_v) + ROLN_(H2) + ROLN_(H3) + ROLN_(H4) + ROLN_(H5),
    ROLN_(back) = 2 * ROLN_(polynomials) * ROLN_(hidden), ROLN_(back_v) = 2 * ROLN_(polynomials) * ROLN_(hidden_v),
    ROLN_(planes_1) = ROLN_MAX(ROLN_(hidden), ROLN_(hidden_v)), ROLN_(planes_2) = ROLN_MAX(2 * ROLN_(hidden), ROLN_(hidden_v)),
    ROLN_(planes_3) = ROLN_MAX(3 * ROLN_(hidden), ROLN_(hidden_v)),
    ROLN_(even) = ROLN_MAX(ROLN_(net_inputs), ROLN_MAX(ROLN_(H2), ROLN_(H4))),
    ROLN_(wide) = ROLN_(even) + ROLN_MAX(ROLN_(H1_m), ROLN_MAX(ROLN_(H3), ROLN_(H5))),
    ROLN_(wide_v) = ROLN_(even) + ROLN_MAX(ROLN_(H1_v), ROLN_MAX(ROLN_(H3), ROLN_(H5))),
    ROLN_(H2_to_5) = ROLNI_OR(ROLN_(H5), ROLNI_OR(ROLN_(H4), ROLNI_OR(ROLN_(H3), ROLN_(H2)))),
    ROLN_(last_m) = ROLNI_OR(ROLN_(H2_to_5), ROLN_(H1_m)),
    ROLN_(last_v) = ROLNI_OR(ROLN_(H2_to_5), ROLN_(H1_v)),
    ROLN_(trunk) = (ROLN_(net_inputs) + 1) * ROLN_(H1) + (ROLN_(H1) + 1) * ROLN_(H2) + (ROLN_(H2) + 1) * ROLN_(H3) +
                    (ROLN_(H3) + 1) * ROLN_(H4) + (ROLN_(H4) + 1) * ROLN_(H5),
    /* SPD layers: kinds */
    ROLN_(L0) = ROLNI_KIND(ROLNI_AT(0, ROLN_LAYERS)), ROLN_(L1) = ROLNI_KIND(ROLNI_AT(1, ROLN_LAYERS)),
    ROLN_(L2) = ROLNI_KIND(ROLNI_AT(2, ROLN_LAYERS)), ROLN_(L3) = ROLNI_KIND(ROLNI_AT(3, ROLN_LAYERS)),
    ROLN_(layers) = (ROLN_(L0) > 0) + (ROLN_(L1) > 0) + (ROLN_(L2) > 0) + (ROLN_(L3) > 0),
    ROLN_(tri) = ROLN_TRI(ROLN_(n)),
    ROLN_(squares) = ROLNI_AT(1, ROLN_MASS),
    ROLN_(cols) = ROLNI_OR(ROLN_(squares), ROLN_(n)),                           /* of L */
    ROLN_(outputs) = ROLN_(squares) > 0 ? ROLN_(n) * ROLN_(cols) : ROLN_(tri), /* of the mass network */
    ROLN_(base) = ROLN_BASE,
    ROLN_(damping) = ROLN_DAMPING,
    ROLN_(damper) = ROLNI_DAMPER(ROLN_DAMPING, ROLN_(n)), /* outputs of its network */
    ROLN_(friction) = ROLN_FRICTION,
    ROLN_(cholesky) = ROLNI_MASS_KIND(ROLNI_AT(0, ROLN_MASS)) == ROLN_CHOLESKY,
    ROLN_(driven) = ROLN_DRIVEN,
    ROLN_(keeps) = (ROLN_(ae_layers) > 0) * ROLN_(driven), /* coordinates that are driven joints behind an autoencoder */
    ROLN_(formed) = ROLN_(layers) > 0 || ROLN_(cholesky) || ROLN_(driven) > 0,
    /* rows of the networks' kernels (roln_lnn.h, 2) */
    ROLN_(row_mass) = ROLNI_MASS_ROW_WORK(ROLN_),
    ROLN_(row_dm) = ROLNI_DM_WORK(ROLN_),
    ROLN_(row_bwd) = ROLNI_ROW_BWD_WORK(ROLN_, 0, 0),
    ROLN_(row_bwd_0) = ROLNI_ROW_BWD_WORK(ROLN_, 0, 1),
    ROLN_(row_bwd_1) = ROLNI_ROW_BWD_WORK(ROLN_, 1, 1),
    ROLN_(row_bwd_2) = ROLNI_ROW_BWD_WORK(ROLN_, 2, 1),
    ROLN_(curve_1) = ROLNI_CURVATURE_WORK(ROLN_, 1),
    ROLN_(curve_2) = ROLNI_CURVATURE_WORK(ROLN_, 2),
    ROLN_(row_jac_1) = ROLNI_MOTION_JAC_WORK(ROLN_, 1),
    ROLN_(row_jac_2) = ROLNI_MOTION_JAC_WORK(ROLN_, 2),
    ROLN_(row_mass_0) = ROLNI_MASS_ONLY_WORK(ROLN_),
    ROLN_(row_gradient_0) = ROLNI_GRADIENT_ROW_WORK(ROLN_, 0),
    ROLN_(row_gradient_1) = ROLNI_GRADIENT_ROW_WORK(ROLN_, 1),
    ROLN_(row_all_0) = ROLNI_ALL_ROW_WORK(ROLN_, 0),
    ROLN_(row_all_1) = ROLNI_ALL_ROW_WORK(ROLN_, 1),
    ROLN_(guard_net_work) = ROLNI_EVAL_WORK(ROLN_, 1, 0, ROLNI_ALL_OF_D(ROLN_FRICTION), 1), /* of what the guard asks for */
    /* parameters, and what training adds to them */
    ROLN_(net_size) = 2 * ROLN_(trunk) + (ROLN_(last_m) + 1) * ROLN_(outputs) + ROLN_(last_v) + 1 +
                       ((ROLN_DAMPING) ? ROLN_(trunk) + (ROLN_(last_m) + 1) * ROLN_(damper) : 0) +
                       ROLNI_LAW(ROLN_FRICTION) * ROLN_(n),
    ROLN_(base_size) = (ROLN_BASE) > 0 ? ROLN_(n) * ROLN_(n) : 0,
    ROLN_(own) = ROLNI_OWN(ROLN_SCALE), /* 1: joints have units of their own */
    ROLN_(inputs) = ROLN_INPUTS,
    ROLN_(actuator) = ROLNI_ACTUATOR(ROLN_ACTUATOR),
    ROLN_(servo) = ROLN_(actuator) == 2,
    ROLN_(input_size) = ROLN_(N) * ((ROLN_INPUTS) + ROLNI_ACTUATOR_NUMBERS(ROLN_(actuator))),
    ROLN_(force_size) = ROLNI_OR(ROLN_INPUTS, ROLN_(N)),
    ROLN_(rest_size) = ROLN_(net_size) + ROLN_(base_size) + ROLN_(layers) * (ROLN_(tri) + ROLN_(n) * ROLN_(n)) +
                        ROLN_(input_size),
    ROLN_(theta_size) = ROLN_(ae_size) + ROLN_(rest_size),
    ROLN_(bend_size) = ROLN_(monomials) * ROLN_(bent),
    ROLN_(full_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_FULL, +) + ROLN_(bend_size) + ROLN_(rest_size), /* none stored small */
    ROLN_(moment_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_MOMENTS, +) + ROLN_(bend_size) + ROLN_(net_size) + (ROLN_BASE ? 1 : 0) +
                          ROLN_(layers) * (ROLN_(tri) + 1) + ROLN_(input_size),
    ROLN_(keep_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_UPDATE, +) + (ROLN_BASE ? 2 * ROLN_(base_size) + 2 : 0) +
                        ROLN_(layers) * (2 * ROLN_(n) * ROLN_(n) + 2),
    ROLN_(steps) = ROLNI_AT(0, ROLN_PLAN),
    ROLN_(motors) = ROLNI_AT(1, ROLN_PLAN),
    ROLN_(newton_size) = ROLNI_LEARN(ROLN_LEARN) ? ROLN_(rest_size) : ROLN_(theta_size), /* parameters that Gauss-Newton moves */
    ROLN_(newton_side) = ROLN_NEWTON_SIDE(ROLN_GN_ROWS, ROLN_(newton_size)),
    ROLN_(horizon) = ROLN_HORIZON,
    ROLN_(load) = ROLN_LOAD,
    ROLN_(delay) = ROLN_DELAY,
    ROLN_(filtered) = (2 + (ROLN_LOAD)) * ROLN_(n), /* numbers that a filter estimates */
    ROLN_(scheme) = ROLNI_SCHEME(ROLN_INTEGRATOR),
    ROLN_(centres) = 8, /* states whose gains an observer holds */
    /* of NAME_doubt: is there the square of a state; degree of the polynomials of z, so that 4 coordinates take 24 kB, and of those
       of one number of x alone; terms */
    ROLN_(squared) = ROLN_(n) < 9,
    ROLN_(degree_z) = ROLN_(net_inputs) < 3 ? 8 : ROLN_(net_inputs) < 4 ? 6 : ROLN_(net_inputs) < 5 ? 4 :
                      ROLN_(net_inputs) < 6 ? 3 : 2 * ROLN_(squared),
    ROLN_(degree_x) = ROLN_(squared) ? ROLN_MAX(ROLN_(degree_z), 6) : 0,
    ROLN_(of_x) = ROLN_MONOMIALS(ROLN_(net_inputs), ROLN_(degree_z)) + ROLN_(net_inputs) * (ROLN_(degree_x) - ROLN_(degree_z)),
    ROLN_(terms) = 1 + ROLN_(net_inputs) + ROLN_(of_x) + ROLN_(n) +
                   ROLN_(squared) * (ROLN_(n) * ROLN_(net_inputs) + ROLN_TRI(ROLN_(n))),
    ROLN_(guard_x) = ROLN_MAX(ROLNI_TAU(ROLN_, 1), ROLN_(terms)), /* scratch of the guard */
    ROLN_(leaps) = ROLNI_FILTER(ROLN_FILTER), /* 1: the filter looks ahead by leapfrog, and knows M^-1 by the load's derivative */
    ROLN_(looks) = ROLN_MAX(ROLN_(leaps), ROLN_LOAD) * ROLN_(n), /* derivatives by a load that the filter wants */
    ROLN_(stored) = ROLNI_BITS(ROLN_QUANTISE) / 8, /* 1: int8, 2: half */
    ROLN_(twice) = sizeof(roln_real) == 8,
    ROLN_(format) = ROLNI_FORMAT(ROLN_(actuator), ROLN_(driven), ROLN_(degree_m), ROLN_(squares)),
    ROLN_(sizes) = ROLN_SIZES(ROLN_(ae_layers), ROLN_(mlp_layers), ROLN_(layers), ROLN_(angles), ROLN_(driven), ROLN_(degree_m),
                               ROLN_(squares)), /* packed */
    /* a step of one state, without and with what derivatives take */
    ROLN_(stage_once_1) = ROLNI_STAGE_WORK(ROLN_, 0, 1),
    ROLN_(midpoint_once_1) = ROLNI_MIDPOINT_WORK(ROLN_, 0, 1),
    ROLN_(step_once_1) = ROLNI_STEP_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), 1, ROLN_(stage_once_1), ROLN_(midpoint_once_1)),
    ROLN_(stage_1) = ROLNI_STAGE_WORK(ROLN_, 1, 1),
    ROLN_(midpoint_1) = ROLNI_MIDPOINT_WORK(ROLN_, 1, 1),
    ROLN_(step_1) = ROLNI_STEP_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), 1, ROLN_(stage_1), ROLN_(midpoint_1)),
    ROLN_(dissipation) = ROLNI_DISSIPATION_JAC_WORK(ROLN_),
    ROLN_(zdd_jac) = ROLN_LNN_ZDD_JAC_WORK(ROLN_),
    ROLN_(midpoint_row) = ROLNI_MIDPOINT_ROW_WORK(ROLN_),
    ROLN_(jac_tau) = ROLN_LNN_STEP_JAC_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), ROLN_(force_size)),
    ROLN_(jac_load) = ROLN_LNN_STEP_JAC_WORK(ROLN_, ROLN_(leaps) ? ROLN_LEAPFROG : ROLNI_INT(ROLN_(scheme)), ROLN_(looks)),
    ROLN_(stick_slopes) = ROLNI_STICK_SLOPES_WORK(ROLN_),
    ROLN_(leap_1) = ROLNI_STEP_WORK(ROLN_, ROLN_LEAPFROG, 1, ROLN_(stage_once_1), 0),
    ROLN_(advance_1) = (ROLN_STICTION) > 0 ? ROLN_LNN_STICK_WORK(ROLN_, ROLN_(step_once_1), 1) : ROLN_(step_once_1),
    /* tapes and steps of a block of states: once, kept for a backward, the backward; mid: of the midpoint rule, which the
       variational loss takes */
    ROLN_(once_tape) = ROLN_LNN_TAPE(ROLN_, 1, 0, ROLN_BLOCK),
    ROLN_(kept_tape) = ROLN_LNN_TAPE(ROLN_, 1, 1, ROLN_BLOCK),
    ROLN_(step_tapes) = ROLN_STAGES(ROLNI_INT(ROLN_(scheme))) * ROLN_(kept_tape),
    ROLN_(mid_tapes) = ROLN_STAGES(ROLN_MIDPOINT) * ROLN_(kept_tape),
    ROLN_(stage_once) = ROLNI_STAGE_WORK(ROLN_, 0, ROLN_BLOCK),
    ROLN_(midpoint_once) = ROLNI_MIDPOINT_WORK(ROLN_, 0, ROLN_BLOCK),
    ROLN_(step_once) = ROLNI_STEP_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), ROLN_BLOCK, ROLN_(stage_once), ROLN_(midpoint_once)),
    ROLN_(advance) = (ROLN_STICTION) > 0 ? ROLN_LNN_STICK_WORK(ROLN_, ROLN_(step_once), ROLN_BLOCK) : ROLN_(step_once),
    ROLN_(mid_once) = ROLNI_STEP_WORK(ROLN_, ROLN_MIDPOINT, ROLN_BLOCK, 0, ROLN_(midpoint_once)),
    ROLN_(start_once) = ROLN_LNN_START_WORK(ROLN_, 0, ROLN_BLOCK),
    ROLN_(stage_kept) = ROLNI_STAGE_WORK(ROLN_, 1, ROLN_BLOCK),
    ROLN_(midpoint_kept) = ROLNI_MIDPOINT_WORK(ROLN_, 1, ROLN_BLOCK),
    ROLN_(step_kept) = ROLNI_STEP_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), ROLN_BLOCK, ROLN_(stage_kept), ROLN_(midpoint_kept)),
    ROLN_(mid_kept) = ROLNI_STEP_WORK(ROLN_, ROLN_MIDPOINT, ROLN_BLOCK, 0, ROLN_(midpoint_kept)),
    ROLN_(start_kept) = ROLN_LNN_START_WORK(ROLN_, 1, ROLN_BLOCK),
    ROLN_(stage_bwd) = ROLNI_STAGE_BWD_WORK(ROLN_, ROLN_BLOCK),
    ROLN_(mid_bwd) = ROLNI_MIDPOINT_BWD_WORK(ROLN_, ROLN_BLOCK),
    ROLN_(step_bwd) = ROLNI_STEP_BWD_WORK(ROLN_, ROLNI_INT(ROLN_(scheme)), ROLN_BLOCK, ROLN_(stage_bwd), ROLN_(mid_bwd)),
    ROLN_(start_bwd) = ROLN_LNN_START_BWD_WORK(ROLN_, ROLN_BLOCK),
    ROLN_(inverse_kept) = ROLN_LNN_INVERSE_WORK(ROLN_, 1, 1, ROLN_BLOCK),
    ROLN_(inverse_bwd) = ROLN_LNN_INVERSE_BWD_WORK(ROLN_, ROLN_BLOCK),
    ROLN_(packed_size) = ROLN_PACKED(ROLN_(sizes), ROLN_(own) * ROLN_(N), ROLN_(n), ROLN_(theta_size)),
    ROLN_(full_packed_size) = ROLN_PACKED(ROLN_(sizes), ROLN_(own) * ROLN_(N), ROLN_(n), ROLN_(full_size))
ROLNI_INTS_END;

ROLNI_ASSERT(sizes_must_be_at_least_1,
             ROLNI_GIVEN(0, ROLN_AE) && ROLNI_GIVEN(1, ROLN_AE) && ROLNI_GIVEN(2, ROLN_AE) && ROLNI_GIVEN(3, ROLN_AE) &&
                 ROLNI_GIVEN(4, ROLN_AE) && ROLNI_GIVEN(5, ROLN_AE) && ROLNI_GIVEN(6, ROLN_AE) && ROLNI_GIVEN(7, ROLN_AE) &&
                 ROLNI_GIVEN(8, ROLN_AE))
ROLNI_ASSERT(sizes_must_not_grow, (ROLNI_EACH_LAYER(ROLNI_LAYER_OK, &&)) && ROLNI_AT(9, ROLN_AE) == 0)
ROLNI_ASSERT(chart_is_none_or_of_degree_2_to_8,
             (ROLNI_BENDS(ROLNI_AT(0, ROLN_CHART)) ? ROLN_(degree) >= 2 && ROLN_(degree) <= ROLN_DEGREE_MAX
                                                   : ROLN_(degree) == 0) && ROLNI_AT(2, ROLN_CHART) == 0)
ROLNI_ASSERT(chart_needs_a_layer_that_reduces, ROLN_(degree) == 0 || ROLN_(n) < ROLN_(outer))
ROLNI_ASSERT(squares_need_a_number_of_columns_n_at_least, ROLNI_SQUARES(ROLNI_AT(0, ROLN_MASS)) == 0 || ROLN_(squares) >= ROLN_(n))
ROLNI_ASSERT(squares_need_fewer_than_65536_columns, ROLN_(squares) < 65536)
ROLNI_ASSERT(mass_takes_one_number_with_squares_else_none,
             ROLNI_AT(2, ROLN_MASS) == 0 && (ROLNI_SQUARES(ROLNI_AT(0, ROLN_MASS)) > 0 || ROLN_(squares) == 0))
ROLNI_ASSERT(cholesky_takes_no_base_nor_layers, !ROLN_(cholesky) || (ROLN_(layers) == 0 && !(ROLN_BASE)))
ROLNI_ASSERT(spd_layers_4_at_most, (ROLN_(L1) == 0 || ROLN_(L0) > 0) && (ROLN_(L2) == 0 || ROLN_(L1) > 0) &&
                                       (ROLN_(L3) == 0 || ROLN_(L2) > 0) && ROLNI_KIND(ROLNI_AT(4, ROLN_LAYERS)) == 0)
ROLNI_ASSERT(polynomials_need_two_degrees_2_to_8,
             ROLN_(polynomials) == 0 || (ROLN_(degree_m) >= 2 && ROLN_(degree_m) <= ROLN_DEGREE_MAX && ROLN_(degree_v) >= 2 &&
                                         ROLN_(degree_v) <= ROLN_DEGREE_MAX && ROLNI_AT(2, ROLN_POLYNOMIALS) == 0))
ROLNI_ASSERT(polynomials_take_no_base_nor_layers, ROLN_(polynomials) == 0 || (ROLN_(layers) == 0 && !(ROLN_BASE)))
ROLNI_ASSERT(polynomials_take_64_inputs_at_most, ROLN_(polynomials) == 0 || ROLN_(net_inputs) <= ROLN_VARIABLES_MAX)
ROLNI_ASSERT(polynomials_are_fewer_than_65536,
             ROLN_MONOMIALS(ROLNI_AS(int64_t, ROLN_(net_inputs)), ROLN_MAX(ROLN_(degree_m), ROLN_(degree_v))) < 65536)
ROLNI_ASSERT(mlp_needs_1_to_5_widths, ROLN_(polynomials) > 0 ||
                                          (ROLNI_GIVEN(0, ROLN_MLP) && ROLNI_GIVEN(1, ROLN_MLP) && ROLNI_GIVEN(2, ROLN_MLP) &&
                                           ROLNI_GIVEN(3, ROLN_MLP) && ROLNI_GIVEN(4, ROLN_MLP) && ROLNI_AT(5, ROLN_MLP) == 0))
ROLNI_ASSERT(sizes_fit_the_packed_format, ROLN_(N) < 65536 && ROLN_(wide) < 65536)
ROLNI_ASSERT(angles_are_0_or_1_for_each_joint,
             ROLNI_TOTAL(ROLNI_NO_BIT, ROLN_ANGLES) == 0 &&
                 (ROLNI_COUNT(ROLN_ANGLES) == ROLN_(N) || (ROLNI_COUNT(ROLN_ANGLES) == 1 && ROLN_(angles) == 0)))
ROLNI_ASSERT(angles_need_a_model_without_autoencoder, ROLN_(angles) == 0 || ROLN_(ae_layers) == 0)
ROLNI_ASSERT(angles_need_31_joints_at_most, ROLN_(angles) == 0 || ROLN_(N) <= ROLN_ANGLES_MAX)
ROLNI_ASSERT(inputs_at_most_N, (ROLN_INPUTS) >= 0 && (ROLN_INPUTS) <= ROLN_(N))
ROLNI_ASSERT(driven_leaves_a_coordinate_free, (ROLN_DRIVEN) >= 0 && (ROLN_DRIVEN) < ROLN_(n))
ROLNI_ASSERT(driven_behind_an_autoencoder_needs_a_chart_of_one_layer,
             ROLN_(keeps) == 0 || (ROLN_(degree) > 0 && ROLN_(ae_layers) == 1))
ROLNI_ASSERT(driven_behind_an_autoencoder_takes_full_weights, ROLN_(keeps) == 0 || ROLNI_BITS(ROLN_QUANTISE) == 0)
ROLNI_ASSERT(driven_behind_an_autoencoder_learns_networks, ROLN_(keeps) == 0 || ROLNI_LEARN(ROLN_LEARN))
ROLNI_ASSERT(driven_takes_no_midpoint_rule, ROLN_(driven) == 0 || ROLNI_INT(ROLN_(scheme)) != ROLN_MIDPOINT)
ROLNI_ASSERT(driven_takes_no_inputs_actuator_nor_load,
             ROLN_(driven) == 0 || ((ROLN_INPUTS) == 0 && ROLN_(actuator) == 0 && (ROLN_LOAD) == 0))
ROLNI_ASSERT(inputs_are_0_with_an_actuator, (ROLN_INPUTS) == 0 || ROLN_(actuator) == 0)
ROLNI_ASSERT(base_is_0_or_1, (ROLN_BASE) * (ROLN_BASE) == (ROLN_BASE))
ROLNI_ASSERT(damping_is_0_1_or_2, (ROLN_DAMPING) >= 0 && (ROLN_DAMPING) <= 2)
ROLNI_ASSERT(friction_is_0_1_or_2, (ROLN_FRICTION) >= 0 && (ROLN_FRICTION) <= 2)
ROLNI_ASSERT(stiction_is_0_or_1, (ROLN_STICTION) * (ROLN_STICTION) == (ROLN_STICTION))
ROLNI_ASSERT(stiction_needs_friction, (ROLN_STICTION) == 0 || (ROLN_FRICTION) > 0)
ROLNI_ASSERT(stiction_takes_no_driven_joints, (ROLN_STICTION) == 0 || ROLN_(driven) == 0)
ROLNI_ASSERT(filter_leapfrog_takes_no_stiction, ROLN_(leaps) == 0 || (ROLN_STICTION) == 0)
ROLNI_ASSERT(load_is_0_or_1, (ROLN_LOAD) * (ROLN_LOAD) == (ROLN_LOAD))
ROLNI_ASSERT(delay_must_not_be_negative, (ROLN_DELAY) >= 0)
ROLNI_ASSERT(block_at_least_1, (ROLN_BLOCK) >= 1)
ROLNI_ASSERT(horizon_at_least_1, (ROLN_HORIZON) >= 1)
ROLNI_ASSERT(rows_must_not_be_negative, (ROLN_GN_ROWS) >= 0)
ROLNI_ASSERT(plan_must_be_steps_and_motors,
             ROLN_(steps) == 0 ? ROLN_(motors) == 0 : ROLN_(steps) > 0 && ROLN_(motors) > 0 && ROLNI_AT(2, ROLN_PLAN) == 0)
ROLNI_ASSERT(motors_must_not_be_more_than_joints, ROLN_(motors) <= ROLN_MAX(ROLN_(N), ROLN_(force_size)))
ROLNI_ASSERT(stored_weights_need_float, ROLNI_BITS(ROLN_QUANTISE) == 0 || sizeof(roln_real) == 4)

/* Parameters: const in flash for inference. slope, eigenvalue_floor: of the config that they belong to, without which every
   function that evaluates the model returns ROLN_E_SHAPE; each: with ROLN_SCALE each; dt: step used in training, s; z_min, z_max,
   zd_max: range seen in training. */
typedef struct {
    roln_real slope, eigenvalue_floor;
    roln_scale scale;
#if ROLNI_OWN(ROLN_SCALE)
    roln_real each[ROLN_(N)];
#endif
    roln_real dt, z_min[ROLN_(n)], z_max[ROLN_(n)], zd_max[ROLN_(n)];
    roln_real theta[ROLN_(theta_size)];
} ROLN_(params);
ROLNI_ASSERT(params_are_numbers_only,
             sizeof(ROLN_(params)) == ROLN_NUMBERS(ROLN_(own) * ROLN_(N), ROLN_(n), ROLN_(theta_size)) * sizeof(roln_real))

/* The own units of the joints in p; without ROLN_SCALE each there are none. */
#if ROLNI_OWN(ROLN_SCALE)
#define ROLNI_EACH(p) (p)->each
#else
#define ROLNI_EACH(p) NULL
#endif

typedef struct { roln_real q[ROLN_(N)], qd[ROLN_(N)]; } ROLN_(state);  /* full state: q, and qd in units of q per second */
typedef struct { roln_real z[ROLN_(n)], zd[ROLN_(n)]; } ROLN_(latent); /* latent state; z = 0 is no special pose */
typedef struct {
    roln_real z[ROLN_(n)], zd[ROLN_(n)], zdd[ROLN_(n)], kp[ROLN_(n)], kd[ROLN_(n)];
#if ROLN_LOAD > 0
    const roln_real *load; /* [n] that PD+ works against, such as that of NAME_filter; NULL: none */
#endif
} ROLN_(target);
#if ROLN_DELAY > 0
/* zero it once; tau: to be sent. sent: those before tau, the oldest first. sent[0] acted until this tick: it is what
   NAME_filter_tick asks for. The others and tau are on their way. To arm again, zero g alone. */
typedef struct { roln_guard g; roln_real tau[ROLN_(force_size)], sent[ROLN_DELAY][ROLN_(force_size)]; } ROLN_(guard);
#else
typedef struct { roln_guard g; roln_real tau[ROLN_(force_size)]; } ROLN_(guard); /* zero it once; tau: to be applied */
#endif
typedef struct { roln_real M[ROLN_(n) * ROLN_(n)], c[ROLN_(n)], g[ROLN_(n)], d[ROLN_(n)], T, V; } ROLN_(equation);
typedef struct { roln_real A[4 * ROLN_(n) * ROLN_(n)], B[2 * ROLN_(n) * ROLN_(force_size)]; } ROLN_(jacobian);
/* zero it once; s, load: the estimate, F^T F: the covariance of its error; zdd: of the last step of leapfrog */
typedef struct {
    roln_filter f;
    ROLN_(latent) s;
#if ROLN_LOAD > 0
    roln_real load[ROLN_(n)];
#endif
#if ROLNI_FILTER(ROLN_FILTER) > 0
    roln_real zdd[ROLN_(n)];
#endif
    roln_real F[ROLN_(filtered) * ROLN_(filtered)];
} ROLN_(filter);

/* zero it once; s: the estimate; zdd: of the last step of leapfrog; age: ticks since it started */
typedef struct {
    roln_filter f;
    ROLN_(latent) s;
#if ROLN_STICTION == 0
    roln_real zdd[ROLN_(n)];
#endif
    roln_real age;
} ROLN_(observer);

/* Settings and gains of NAME_observer_tick. NAME_fit_observer computes them. They are constant and may be in flash. */
typedef struct {
    roln_real dt, gate;    /* as in roln_noise */
    int lost;              /* as in roln_noise */
    roln_real q[ROLN_(N)]; /* deviation of each measured joint from phi(z), rad */
    roln_real e[ROLN_(N)]; /* deviation of each measured joint from what is expected, rad; for the gate */
    roln_real settle;      /* ticks after a start from which on the gains of a start become the steady ones */
    roln_real z[ROLN_(centres)][ROLN_(n)];                   /* at these states .. */
    roln_real P[2][ROLN_(centres)][2 * ROLN_(n) * ROLN_(n)]; /* .. the covariance of (z, zd) with z: steady, of a start */
} ROLN_(observer_gains);

/* Evidence of recordings for NAME_doubt: how their states are spread, and how far the model was off there. Zero-initialised: no
   state was seen. NAME_doubt does not write it, so it may be in flash. */
typedef struct {
    roln_real count;               /* 1 and the states of NAME_evidence_add, at most 1 / (64 ROLN_EPS); 0: none yet */
    roln_real L[ROLN_TRI(ROLN_(terms))]; /* their mean of t t^T is L L^T (rolni_novelty): rows of the lower triangle */
    /* deviations are (always^2 + grows^2 novelty^(halves / 2))^(1/2): of zdd, 1/s^2, and of the force on z, J */
    int halves;
    roln_real always[2 * ROLN_(n)], grows[2 * ROLN_(n)];
    roln_real lasts; /* correlation time of errors of zdd, s; 0: unknown */
} ROLN_(evidence);

/* Output of NAME_doubt: the novelty of a state, and standard deviations of the model's acceleration and latent force there. */
typedef struct { roln_real novelty, zdd[ROLN_(n)], force[ROLN_(n)]; } ROLN_(doubts);

/* Covariances of a roll-out for NAME_doubt_ahead, 0 at its start. P: of z, zd. C: of z, zd with errors of one deviation. */
typedef struct { roln_real P[4 * ROLN_(n) * ROLN_(n)], C[2 * ROLN_(n) * ROLN_(n)]; } ROLN_(outlook);

/* The torque that acted until this tick; number k, 0 .. ROLN_DELAY - 1, of those on their way. */
#if ROLN_DELAY > 0
#define ROLNI_ACTING(guard) (guard)->sent[0]
#define ROLNI_COMING(guard, k) ((k) + 1 < ROLN_(delay) ? (guard)->sent[(k) + 1] : (guard)->tau)
#else
#define ROLNI_ACTING(guard) (guard)->tau
#endif

/* The load of x; NULL without ROLN_LOAD. */
#if ROLN_LOAD > 0
#define ROLNI_LOAD_OF(x) (x)->load
#else
#define ROLNI_LOAD_OF(x) NULL
#endif

/* The acceleration of the last step of leapfrog of a filter, and of an observer; NULL where they take steps of the model's
   integrator. */
#if ROLNI_FILTER(ROLN_FILTER) > 0
#define ROLNI_LAST_OF_FILTER(x) (x)->zdd
#else
#define ROLNI_LAST_OF_FILTER(x) NULL
#endif
#if ROLN_STICTION == 0
#define ROLNI_LAST_OF_OBSERVER(x) (x)->zdd
#else
#define ROLNI_LAST_OF_OBSERVER(x) NULL
#endif

#if ROLNI_AT(0, ROLN_PLAN) > 0
/* zero it once; the plan: states, torques, feedback. NAME_plan_next alone reads and writes A to `of`, also when it fails. A, B:
   derivatives of each step. at: the state and the torques at which they were computed. to: the state after that step. of: the model
   (ROLNI_(plan_model)), 0: no derivatives. */
typedef struct {
    roln_plan plan;
    roln_real A[ROLN_(steps) * 4 * ROLN_(n) * ROLN_(n)], B[ROLN_(steps) * 2 * ROLN_(n) * ROLN_(motors)];
    roln_real at[ROLN_(steps) * (2 * ROLN_(n) + ROLN_(motors))], to[ROLN_(steps) * 2 * ROLN_(n)];
    roln_bits of[ROLN_(steps)];
    ROLN_(latent) s[ROLN_(steps) + 1];
    roln_real u[ROLN_(steps) * ROLN_(motors)], K[ROLN_(steps) * ROLN_(motors) * 2 * ROLN_(n)];
} ROLN_(plan);
#endif

#define ROLNI_MLP_OF(which, out) \
    {ROLN_(mlp_layers), \
     {ROLN_(net_inputs), ROLN_(H1_##which), ROLNI_OR(ROLN_(H2), out), ROLNI_OR(ROLN_(H3), out), ROLNI_OR(ROLN_(H4), out), \
      ROLNI_OR(ROLN_(H5), out), out}, ROLN_(degree_##which)}
#define ROLNI_LNN_OF(friction) \
    {ROLN_(n) * ROLNI_EIGENVALUE_FLOOR_IS_ABOVE_0(ROLN_EIGENVALUE_FLOOR), ROLNI_MASS_KIND(ROLNI_AT(0, ROLN_MASS)), \
     ROLN_(squares), ROLN_BASE, ROLN_(layers), ROLN_DAMPING, ROLNI_AS(roln_real, ROLN_EIGENVALUE_FLOOR), \
     ROLNI_MLP_OF(m, ROLN_(outputs)), ROLNI_MLP_OF(v, 1), ROLNI_MLP_OF(m, ROLNI_OR(ROLN_(damper), ROLN_(tri))), ROLN_(angles), \
     friction, ROLN_(driven)}
static const roln_model ROLN_(model) = {
    {ROLN_(ae_layers),
     {ROLN_(N) * ROLNI_SLOPE_IS_ABOVE_0_AND_AT_MOST_1(ROLN_SLOPE), ROLN_(N1), ROLN_(N2), ROLN_(N3), ROLN_(N4), ROLN_(N5),
      ROLN_(N6), ROLN_(N7), ROLN_(N8)},
     ROLNI_AS(roln_real, ROLN_SLOPE), ROLNI_STORE(ROLN_QUANTISE), ROLNI_CHART(ROLNI_AT(0, ROLN_CHART)), ROLN_(degree),
     ROLN_(monomials), ROLN_(keeps)},
    ROLNI_LNN_OF(ROLN_FRICTION),
    ROLNI_SCHEME(ROLN_INTEGRATOR), ROLN_INPUTS, ROLN_(own), ROLN_(actuator)};
#if ROLN_STICTION > 0
static const roln_lnn ROLNI_(sticking) = ROLNI_LNN_OF(-(ROLN_FRICTION)); /* for steps whose dry friction can hold */
#endif
#undef ROLNI_LNN_OF
#undef ROLNI_MLP_OF

/* ---- 10 a control tick ----------------------------------------------------------------------- */

/* A measurement q, qd becomes z, zd (NAME_encode). The controller turns them into a latent force tau_z (NAME_control), and
   NAME_lift or NAME_allocate turns tau_z into torques. A guard lets the torques pass or not (NAME_guard_tick). NAME_tick is all of
   it. */

/* The parameters of the Lagrangian network. */
ROLN_FN const roln_real *ROLNI_(net)(const ROLN_(params) *p)
{
    return p->theta + ROLN_(ae_size);
}

/* The units of forces, [N]: those of the joints. NULL: all are 1, or the learned input map B contains them, tau = B u. */
ROLN_FN const roln_real *ROLNI_(force_units)(const ROLN_(params) *p)
{
    const roln_real *each = ROLNI_EACH(p);
    (void)p;
    return ROLN_(inputs) > 0 ? NULL : each;
}

/* The common factor from user's units of an input, a force or the position of a servo, to those of the networks.
   ROLNI_(own_inputs) then applies the factor of each joint. With driven joints the common factor is 1. */
ROLN_FN roln_real ROLNI_(input_unit)(const ROLN_(params) *p)
{
    if (ROLN_(driven) > 0) return 1;
    return ROLN_(servo) > 0 ? 1 / p->scale.q : rolni_force_unit(&p->scale);
}

/* The number by which ROLNI_(own_inputs) multiplies input j. each [N] is ROLNI_(force_units) and may be NULL. */
ROLN_FN roln_real ROLNI_(own_input)(const ROLN_(params) *p, const roln_real *each, int j)
{
    const roln_real own = each ? each[j] : 1;
    if (ROLN_(driven) == 0) return ROLN_(servo) > 0 ? 1 / own : own;
    return j < ROLN_(N) - ROLN_(driven) ? rolni_force_unit(&p->scale) * own : rolni_velocity_unit(&p->scale) * p->scale.t / own;
}

/* Inputs x [rows][force_size], times ROLNI_(input_unit), come into the units of the joints: forces are multiplied by them,
   positions of servos and accelerations of driven joints are divided. */
ROLN_FN void ROLNI_(own_inputs)(const ROLN_(params) *p, int rows, roln_real *x)
{
    const roln_real *const each = ROLNI_(force_units)(p);
    int i;
    for (i = 0; i < rows * ROLN_(N) && ROLN_(driven) > 0; i++)
        x[i] *= ROLNI_(own_input)(p, each, i % ROLN_(N));
    if (ROLN_(driven) > 0) return;
    if (ROLN_(servo)) rolni_divide_each(rows, ROLN_(N), ROLNI_EACH(p), x);
    else rolni_multiply_each(rows, ROLN_(force_size), each, x);
}

/* The derivative of a driven coordinate z_i by its joint, N - n + i, in units of the networks. */
ROLN_FN roln_real ROLNI_(driven_slope)(const ROLN_(params) *p, int i)
{
    const int N = ROLN_(N), n = ROLN_(n);
    return ROLN_(keeps) > 0 ? p->theta[(n + i) * N + N - n + i] : 1; /* of Psi */
}

/* The same in user's units: accelerations of the joint are multiplied by it. */
ROLN_FN roln_real ROLNI_(driven_unit)(const ROLN_(params) *p, int i)
{
    const roln_real *const each = ROLNI_EACH(p);
    return ROLNI_(driven_slope)(p, i) / p->scale.q / (each ? each[ROLN_(N) - ROLN_(n) + i] : 1);
}

#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
/* The numbers of the actuators: log k [N], o [N] in units of the networks and, of servos, log d / t [N]. */
ROLN_FN const roln_real *ROLNI_(actuators)(const ROLN_(params) *p)
{
    return p->theta + ROLN_(theta_size) - ROLN_(input_size);
}

/* The derivative of the force on joint j by its input, k in units of the networks. *d, of servos: the damping in these units. */
ROLN_FN roln_real ROLNI_(actuator_slope)(const ROLN_(params) *p, int j, roln_real *d)
{
    const roln_real *const a = ROLNI_(actuators)(p) + j, *const each = ROLNI_EACH(p), own = each ? each[j] : 1;
    const roln_real unit = ROLN_(servo) > 0 ? rolni_force_unit(&p->scale) * p->scale.q * own * own : 1;
    *d = ROLN_(servo) > 0 ? roln_exp(a[2 * ROLN_(N) * ROLN_(servo)]) * unit : 0;
    return roln_exp(a[0]) * unit;
}

/* The force [nb][N] of actuators with inputs `in` [nb][N], to x; of servos at q, qd [nb][N] behind x. */
ROLN_FN void ROLNI_(actuate)(const ROLN_(params) *p, int nb, const roln_real *in, roln_real *x)
{
    const int N = ROLN_(N), m = nb * N;
    const roln_real *const o = ROLNI_(actuators)(p) + N, *const q = x + m * ROLN_(servo), *const qd = q + m * ROLN_(servo);
    int r, j;
    for (j = 0; j < N; j++) {
        roln_real d;
        const roln_real k = ROLNI_(actuator_slope)(p, j, &d);
        for (r = j; r < m; r += N) {
            if (ROLN_(servo)) x[r] = k * (roln_lnn_near(&ROLN_(model).lnn, j, q[r], in[r]) - q[r]) - d * qd[r] + o[j];
            else x[r] = k * in[r] + o[j];
        }
    }
}

/* Backward of ROLNI_(actuate), x as it was for it: of the cotangents g [nb][N] of the force. Adds to ga, the gradient of log k, o,
   log d, NULL: not wanted; writes the cotangents of q, qd behind g, of servos. */
ROLN_FN void ROLNI_(actuate_bwd)(const ROLN_(params) *p, int nb, const roln_real *in, const roln_real *x, roln_real *g,
                                 roln_real *ga)
{
    const int N = ROLN_(N), m = nb * N, servo = ROLN_(servo);
    const roln_real *const q = x + m * servo, *const qd = q + m * servo;
    int r, j;
    for (j = 0; j < N; j++) {
        roln_real d, by_k = 0, by_o = 0, by_d = 0;
        const roln_real k = ROLNI_(actuator_slope)(p, j, &d);
        for (r = j; r < m; r += N) {
            const roln_real e = servo ? roln_lnn_near(&ROLN_(model).lnn, j, q[r], in[r]) - q[r] : in[r];
            by_k += g[r] * k * e, by_o += g[r];
            if (!servo) continue;
            by_d -= g[r] * d * qd[r];
            g[m * servo + r] = -g[r] * k, g[2 * m * servo + r] = -g[r] * d;
        }
        if (!ga) continue;
        ga[j] += by_k, ga[N + j] += by_o;
        if (servo) ga[2 * N * servo + j] += by_d;
    }
}

/* The actuator of joint j in user's units: tau = k u + o, or k (u - q) - d qd + o. */
ROLN_FN rolni_actuator ROLNI_(actuator)(const ROLN_(params) *p, int j)
{
    const roln_real *const a = ROLNI_(actuators)(p) + j, *const each = ROLNI_EACH(p);
    rolni_actuator f;
    f.k = roln_exp(a[0]), f.o = a[ROLN_(N)] / rolni_force_unit(&p->scale) / (each ? each[j] : 1);
    f.d = ROLN_(servo) > 0 ? roln_exp(a[2 * ROLN_(N) * ROLN_(servo)]) * p->scale.t : 0;
    return f;
}

/* The torque of joint j under its input u at q, qd. */
ROLN_FN roln_real ROLNI_(actuator_torque)(const ROLN_(params) *p, int j, roln_real u, roln_real q, roln_real qd)
{
    const rolni_actuator f = ROLNI_(actuator)(p, j);
    return f.k * (ROLN_(servo) > 0 ? roln_lnn_near(&ROLN_(model).lnn, j, q, u) - q : u) - f.d * qd + f.o;
}

/* tau [N] becomes the inputs that make it, at = [q; qd] of servos: (tau - o) / k, or q + (tau - o + d qd) / k. */
ROLN_FN void ROLNI_(command)(const ROLN_(params) *p, const roln_real *at, roln_real *tau)
{
    int j;
    for (j = 0; j < ROLN_(N); j++) {
        const rolni_actuator f = ROLNI_(actuator)(p, j);
        if (ROLN_(servo)) tau[j] = at[j] + (tau[j] - f.o + f.d * at[ROLN_(N) + j]) / f.k;
        else tau[j] = (tau[j] - f.o) / f.k;
    }
}

/* k = 1, o = 0, d small: e^-2 t k. */
ROLN_FN void ROLNI_(actuator_init)(ROLN_(params) *p)
{
    roln_real *const a = p->theta + ROLN_(theta_size) - ROLN_(input_size);
    int j;
    for (j = 0; j < ROLN_(input_size); j++)
        a[j] = j < 2 * ROLN_(N) ? 0 : -2;
}
#endif

/* The force on the joints in units of the networks, [nb][N], of nb forces `in` [nb][force_size]: `in` itself or, with inputs, B in,
   or that of actuators, which is written to x. Returns where it is. Of servos q, qd [nb][N] stand behind x. */
ROLN_FN const roln_real *ROLNI_(joint_force)(const ROLN_(params) *p, int nb, const roln_real *in, roln_real *x)
{
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    ROLNI_(actuate)(p, nb, in, x);
#else
    if (ROLN_(inputs) == 0) return in;
    roln_mm_bt(nb, ROLN_(inputs), ROLN_(N), in, p->theta + ROLN_(theta_size) - ROLN_(input_size), x);
#endif
    return x;
}

/* Nonzero if the numbers are of another slope or eigenvalue floor than the model that was compiled, or were never set; with angles
   also if their scale.q or each is not 1. */
ROLN_FN int ROLN_(params_mismatch)(const ROLN_(params) *p)
{
    return !(p->slope == ROLN_(model).ae.slope && p->eigenvalue_floor == ROLN_(model).lnn.eigenvalue_floor &&
             (ROLN_(angles) == 0 || (p->scale.q == 1 && rolni_each_turns(&ROLN_(model), ROLNI_EACH(p)))));
}

/* s = the encoder's jets [jets][n] of q, qd and qdd [N], jets = 3, or 2 with qdd NULL. The end of tape
   [ROLN_AE_ENCODE_REST(ROLN_, jets, 1) + jets N] takes q, qd, qdd in units of the networks. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLNI_(encode)(const ROLN_(params) *p, const roln_real *q, const roln_real *qd, const roln_real *qdd,
                                   roln_real *s, roln_real *tape)
{
    const int N = ROLN_(N), jets = qdd ? 3 : 2;
    roln_real *const x = tape + ROLN_AE_ENCODE_REST(ROLN_, jets, 1);
    int i;
    for (i = 0; i < N; i++) {
        x[i] = q[i] / p->scale.q;
        x[N + i] = qd[i] / p->scale.q;
        if (qdd) x[2 * N + i] = qdd[i] / p->scale.q;
    }
    rolni_divide_each(jets, N, ROLNI_EACH(p), x);
    roln_ae_encode(&ROLN_(model).ae, jets, 1, p->theta, x, s, tape);
    return roln_all_finite(jets * ROLN_(n), s) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* scratch of NAME_encode: z, zd, and the tape of the encoder, whose end are q, qd in units of the networks */
typedef struct {
    roln_real s[2 * ROLN_(n)], tape[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)];
} ROLN_(encode_work);

/* z = rho(q), zd = D(q) qd. s stays as it was unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(encode)(const ROLN_(params) *p, const ROLN_(state) *x, ROLN_(latent) *s, ROLN_(encode_work) *w)
{
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if ((st = ROLNI_(encode)(p, x->q, x->qd, NULL, w->s, w->tape)) != ROLN_OK) return st;
    rolni_copy(ROLN_(n), w->s, s->z);
    rolni_copy(ROLN_(n), w->s + ROLN_(n), s->zd);
    return ROLN_OK;
}

/* scratch of NAME_encode_reference, as NAME_encode_work */
typedef struct {
    roln_real s[3 * ROLN_(n)], tape[ROLN_AE_ENCODE_REST(ROLN_, 3, 1) + 3 * ROLN_(N)];
} ROLN_(encode_reference_work);

/* A reference q, qd, qdd [N], qdd NULL: zdd = 0, in the latent space, z = rho(q), zd = D qd, zdd = D qdd + (dD/dt) qd: the 2-jet
   that control needs. Writes r->z, zd, zdd. The gains in r stay, and all of r unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(encode_reference)(const ROLN_(params) *p, const roln_real q[ROLN_AT_LEAST(ROLN_(N))],
                               const roln_real qd[ROLN_AT_LEAST(ROLN_(N))], const roln_real qdd[ROLN_(N)], ROLN_(target) *r,
                               ROLN_(encode_reference_work) *w)
{
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if ((st = ROLNI_(encode)(p, q, qd, qdd, w->s, w->tape)) != ROLN_OK) return st;
    rolni_copy(ROLN_(n), w->s, r->z);
    rolni_copy(ROLN_(n), w->s + ROLN_(n), r->zd);
    if (qdd) rolni_copy(ROLN_(n), w->s + 2 * ROLN_(n), r->zdd);
    else rolni_zero(ROLN_(n), r->zdd);
    return ROLN_OK;
}

/* x = [phi(z); J(z) zd] [2N] and the tape of the decoder (2-jets). s [2n]: scratch. ROLN_E_NOT_FINITE if x is not finite. */
ROLN_FN roln_status ROLNI_(decode)(const ROLN_(params) *p, const roln_real *z, const roln_real *zd, roln_real *x, roln_real *tape,
                                   roln_real *s)
{
    const int N = ROLN_(N), n = ROLN_(n);
    int i;
    rolni_copy(n, z, s);
    rolni_copy(n, zd, s + n);
    roln_ae_decode(&ROLN_(model).ae, 2, 1, p->theta, s, x, tape);
    for (i = 0; i < 2 * N; i++)
        x[i] *= p->scale.q;
    rolni_multiply_each(2, N, ROLNI_EACH(p), x);
    return roln_all_finite(2 * N, x) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* scratch of NAME_decode: x = [q; qd], s = [z; zd] */
typedef struct {
    roln_real x[2 * ROLN_(N)], s[2 * ROLN_(n)], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
} ROLN_(decode_work);

/* q = phi(z), qd = J(z) zd. x stays as it was unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(decode)(const ROLN_(params) *p, const ROLN_(latent) *s, ROLN_(state) *x, ROLN_(decode_work) *w)
{
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if ((st = ROLNI_(decode)(p, s->z, s->zd, w->x, w->tape, w->s)) != ROLN_OK) return st;
    rolni_copy(ROLN_(N), w->x, x->q);
    rolni_copy(ROLN_(N), w->x + ROLN_(N), x->qd);
    return ROLN_OK;
}

/* s [2n] = [z; zd t]: the state of the network in its own unit of time. */
ROLN_FN void ROLNI_(net_state)(const ROLN_(params) *p, const roln_real *z, const roln_real *zd, roln_real *s)
{
    const int n = ROLN_(n);
    int i;
    for (i = 0; i < n; i++) {
        s[i] = z[i];
        s[n + i] = zd[i] * p->scale.t;
    }
}

/* The energy balance from the tape of the Lagrangian network at z, zd. work [2n]. */
ROLN_FN rolni_balance ROLNI_(balance)(const ROLN_(params) *p, const rolni_tape *t, const roln_real *zd, roln_real *work)
{
    const int n = ROLN_(n);
    const roln_real f = p->scale.m / (p->scale.t * p->scale.t);
    rolni_balance b;
    int i;
    rolni_mul(&ROLN_(model).lnn, t, 0, t->zd, work, work + n);
    b.energy = roln_dot(n, t->zd, work) / 2 * f + t->v[0] * f;
    for (i = 0; i < n; i++)
        work[i] = t->d[i] * f;
    b.lost = roln_dot(n, zd, work);
    return b;
}

/* scratch of NAME_inverse, in units of the networks: [z; zd] in s, v, zdd and then tau_z in a */
typedef struct {
    roln_real s[2 * ROLN_(n)], a[ROLN_(n)], v[ROLN_(n)], tape[ROLN_LNN_TAPE(ROLN_, 2, 0, 1)];
    roln_real work[ROLN_LNN_INVERSE_WORK(ROLN_, 2, 0, 1)];
} ROLN_(inverse_work);

/* NAME_inverse to w->a, and to b the energy balance at (z, zd); b NULL: not wanted. b takes v: only then
   the tape has the two directions that the balance reads. */
ROLN_FN roln_status ROLNI_(inverse)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_real *v, const roln_real *zdd,
                                    rolni_balance *b, ROLN_(inverse_work) *w)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int n = ROLN_(n);
    const roln_real ts = p->scale.t, t2 = ts * ts, unit = p->scale.m;
    roln_real *const a = w->a;
    roln_status st;
    int i;
    ROLNI_(net_state)(p, s->z, s->zd, w->s);
    for (i = 0; i < n; i++) {
        a[i] = zdd[i] * t2;
        w->v[i] = v ? v[i] * ts : 0;
    }
    st = roln_lnn_inverse(lnn, 0, 1, ROLNI_(net)(p), w->s, v ? w->v : NULL, a, a, w->tape, w->work);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        a[i] = a[i] / t2 * unit;
    if (!roln_all_finite(n, a)) return ROLN_E_NOT_FINITE;
    if (b) {
        const rolni_tape t = rolni_tape_of(lnn, 2, 0, 1, w->tape);
        *b = ROLNI_(balance)(p, &t, s->zd, w->work);
    }
    return ROLN_OK;
}

/* scratch of NAME_control; inverse.a becomes tau_z */
typedef struct {
    ROLN_(inverse_work) inverse;
#if ROLN_DRIVEN > 0
    roln_real zdd[ROLN_(n)]; /* with the accelerations of the driven coordinates */
#endif
} ROLN_(control_work);

/* NAME_control, and to b the energy balance at (z, zd), the power of the load among what is lost; b NULL: not wanted. */
ROLN_FN roln_status ROLNI_(control)(const ROLN_(params) *p, const ROLN_(latent) *s, const ROLN_(target) *r, roln_real *tau_z,
                                    rolni_balance *b, ROLN_(control_work) *w)
{
    const int n = ROLN_(n), from = n - ROLN_(driven);
    const roln_real *zdd = r->zdd, *const load = ROLNI_LOAD_OF(r);
    roln_real *const out = w->inverse.a;
    roln_status st;
    int i;
#if ROLN_DRIVEN > 0
    rolni_copy(n, r->zdd, w->zdd);
    for (i = from; i < n; i++) {
        const roln_real e = s->z[i] - roln_lnn_near(&ROLN_(model).lnn, i, s->z[i], r->z[i]);
        w->zdd[i] -= r->kp[i] * e + r->kd[i] * (s->zd[i] - r->zd[i]);
    }
    zdd = w->zdd;
#endif
    if ((st = ROLNI_(inverse)(p, s, r->zd, zdd, b, &w->inverse)) != ROLN_OK) return st;
    for (i = 0; i < from; i++) {
        const roln_real e = s->z[i] - roln_lnn_near(&ROLN_(model).lnn, i, s->z[i], r->z[i]);
        out[i] -= r->kp[i] * e + r->kd[i] * (s->zd[i] - r->zd[i]);
    }
    for (; i < n; i++)
        out[i] = zdd[i];
    for (i = 0; i < n && load; i++)
        out[i] -= load[i];
    if (b && load) b->lost -= roln_dot(n, s->zd, load); /* a force that is known does not unbalance the guard */
    if (!roln_all_finite(n, out)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, out, tau_z);
    return ROLN_OK;
}

/* PD+ control in the latent space (Paden and Panja 1988, on the reduced model): with e = z - z_ref,
       tau_z = M(z) zdd_ref + C(z, zd) zd_ref + g(z) + d(z, zd) - Kp e - Kd ed - load,   e of angles by the shorter way.
   W = 1/2 ed^T M ed + 1/2 e^T Kp e then falls as dW/dt = -ed^T Kd ed, as far as the model is true. The reference and the diagonal
   gains are in r. Of a driven coordinate tau_z is the acceleration zdd_ref - kp e - kd ed, gains in 1/s^2 and 1/s, which takes the
   place of zdd_ref in M zdd_ref: the forces on the others allow for it. tau_z [n] is untouched unless ROLN_OK. NAME_lift follows,
   or NAME_allocate where there are fewer motors. Status of roln_lnn_inverse, ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(control)(const ROLN_(params) *p, const ROLN_(latent) *s, const ROLN_(target) *r,
                                   roln_real tau_z[ROLN_AT_LEAST(ROLN_(n))], ROLN_(control_work) *w)
{
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return ROLNI_(control)(p, s, r, tau_z, NULL, w);
}

/* scratch of NAME_gains: [kp; kd] in out; e is a zd of 1 in one coordinate, x = [q; J e] */
typedef struct {
    roln_real out[2 * ROLN_(n)], e[ROLN_(n)], x[2 * ROLN_(N)], s[2 * ROLN_(n)];
    roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
} ROLN_(gains_work);

/* Gains of NAME_control from gains of the joints, Kp [N] in Nm/rad and Kd [N] in Nms/rad. The work that a spring at each joint does
   is the same, dq^T Kp dq = dz^T (J^T Kp J) dz. r->kp takes the diagonal of J^T Kp J, r->kd that of J^T Kd J:
       kp_j = sum_i Kp_i J_ij^2,   kd_j = sum_i Kd_i J_ij^2,   J = dphi/dz at s
   The coupling of coordinates is left out. It is small for modes of motion (docs/control.md). The gains of a driven joint, in 1/s^2
   and 1/s, are those of its coordinate. r stays as it was unless ROLN_OK.
   ROLN_E_NOT_FINITE. Cost: n NAME_decode. */
ROLN_FN roln_status ROLN_(gains)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_real Kp[ROLN_AT_LEAST(ROLN_(N))],
                                 const roln_real Kd[ROLN_AT_LEAST(ROLN_(N))], ROLN_(target) *r, ROLN_(gains_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_real *const out = w->out;
    int i, j;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    rolni_zero(2 * n, out);
    for (j = 0; j < n; j++) {
        roln_status st;
        for (i = 0; i < n; i++)
            w->e[i] = i == j;
        if ((st = ROLNI_(decode)(p, s->z, w->e, w->x, w->tape, w->s)) != ROLN_OK) return st;
        for (i = 0; i < N - ROLN_(driven); i++) {
            const roln_real J = w->x[N + i];
            out[j] += Kp[i] * (J * J);
            out[n + j] += Kd[i] * (J * J);
        }
    }
    for (j = n - ROLN_(driven); j < n; j++)
        out[j] = Kp[N - n + j], out[n + j] = Kd[N - n + j];
    if (!roln_all_finite(2 * n, out)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, out, r->kp);
    rolni_copy(n, out + n, r->kd);
    return ROLN_OK;
}

/* NAME_lift behind the decoder: tape of the decoder, 2-jets (jets = 2) or positions (1), in; it is spent. at = [q; qd] [2N], read
   for servos. tau [N] is written in any case. work [ROLN_AE_LIFT_WORK(ROLN_, 1)]. */
ROLN_FN roln_status ROLNI_(lift)(const ROLN_(params) *p, int jets, roln_real *tape, const roln_real *tau_z, const roln_real *at,
                                 roln_real *tau, roln_real *work)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const int N = ROLN_(N), n = ROLN_(n);
    const roln_real *force = tau_z;
    int i;
#if ROLN_DRIVEN > 0
    roln_real alone[ROLN_(n)]; /* without accelerations */
    rolni_copy(n, tau_z, alone);
    rolni_zero(ROLN_(driven), alone + n - ROLN_(driven));
    force = alone;
#endif
    roln_ae_lift_tape(ae, jets, 1, tape, tape);
    roln_ae_lift(ae, 1, p->theta, tape, force, tau, work);
    for (i = 0; i < N; i++)
        tau[i] /= p->scale.q;
    rolni_divide_each(1, N, ROLNI_EACH(p), tau);
    for (i = n - ROLN_(driven); i < n; i++)
        tau[N - n + i] = tau_z[i] / ROLNI_(driven_unit)(p, i);
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    ROLNI_(command)(p, at, tau);
#else
    (void)at;
#endif
    return roln_all_finite(N, tau) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* scratch of NAME_lift */
typedef struct {
    roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1 + ROLN_(servo), 1))], out[ROLN_(N)];
    roln_real work[ROLNI_ROOM(ROLN_AE_LIFT_WORK(ROLN_, 1))];
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
    roln_real at[2 * ROLN_(N)], s[2 * ROLN_(n)]; /* [q; qd], and [z; zd] in units of the networks */
#endif
} ROLN_(lift_work);

/* tau = D(phi(z))^T tau_z [N]: the force on q that acts on z as tau_z, J^T tau = tau_z. With ROLN_ACTUATOR current tau is the
   currents that make this force, (tau - o) / k. With servo it is the positions q + (tau - o + d qd) / k, q = phi(z), qd = J zd.
   Of a driven joint tau_z and tau are accelerations. tau is untouched unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(lift)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_real tau_z[ROLN_AT_LEAST(ROLN_(n))],
                                roln_real tau[ROLN_AT_LEAST(ROLN_(N))], ROLN_(lift_work) *w)
{
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!roln_all_finite(ROLN_(n), s->z)) return ROLN_E_NOT_FINITE;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
    if ((st = ROLNI_(decode)(p, s->z, s->zd, w->at, w->tape, w->s)) != ROLN_OK) return st;
    st = ROLNI_(lift)(p, 2, w->tape, tau_z, w->at, w->out, w->work);
#else
    roln_ae_decode(&ROLN_(model).ae, 1, 1, p->theta, s->z, NULL, w->tape);
    st = ROLNI_(lift)(p, 1, w->tape, tau_z, NULL, w->out, w->work);
#endif
    if (st == ROLN_OK) rolni_copy(ROLN_(N), w->out, tau);
    return st;
}

/* `motors`, or the learned inputs where it or its B is NULL. B of the result is NULL if the model has none. */
ROLN_FN roln_motors ROLNI_(motors_of)(const ROLN_(params) *p, const roln_motors *motors)
{
    roln_motors f = {0, NULL, 0};
    if (motors) f = *motors;
    if (!f.B) f.count = ROLN_(inputs);
    if (!f.B && ROLN_(inputs) > 0) f.B = p->theta + ROLN_(theta_size) - ROLN_(input_size);
    return f;
}

/* scratch of NAME_allocate: a motor's force x on the joints, g on z; y and its two corrections; the rest of tau_z */
typedef struct {
    roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1, 1))], x[ROLN_(N)], g[ROLN_(n)], y[3 * ROLN_(n)], rest[ROLN_(n)];
    roln_real R[(ROLN_(n) + 1) * ROLN_(n)]; /* the triangle, and the row that joins it */
    union {
        roln_real reduce[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, 1))];
        roln_real triangle[ROLN_QR_R_WORK(ROLN_(n) + 1, ROLN_(n))];
    } u;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    roln_real wanted[ROLN_(n)]; /* tau_z without the offsets of the actuators */
#endif
} ROLN_(allocate_work);

/* x [N] = column j of B, in units of the networks but for the unit of force; with actuators diag(k) B. */
ROLN_FN void ROLNI_(motor)(const ROLN_(params) *p, const roln_motors *f, int j, roln_real *x)
{
    int i;
    for (i = 0; i < ROLN_(N); i++) {
        x[i] = f->B[i * f->count + j] * p->scale.q;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
        x[i] *= ROLNI_(actuator)(p, i).k;
#endif
    }
    rolni_multiply_each(1, ROLN_(N), ROLNI_(force_units)(p), x);
}

#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
/* tau_z - J^T o [n], to w->wanted. */
ROLN_FN const roln_real *ROLNI_(beside_offsets)(const ROLN_(params) *p, const roln_real *tau_z, ROLN_(allocate_work) *w)
{
    int i;
    for (i = 0; i < ROLN_(N); i++)
        w->x[i] = ROLNI_(actuator)(p, i).o * p->scale.q;
    rolni_multiply_each(1, ROLN_(N), ROLNI_(force_units)(p), w->x);
    roln_ae_reduce(&ROLN_(model).ae, 1, p->theta, w->tape, w->x, w->g, w->u.reduce);
    for (i = 0; i < ROLN_(n); i++)
        w->wanted[i] = tau_z[i] - w->g[i];
    return w->wanted;
}
#endif

/* Motors u [count] for a reduced force, tau = B u: damped least squares (Levenberg-Marquardt),
       u = arg min |G u - tau_z|^2 + mu^2 |u|^2 = G^T y,   y = (G G^T + mu^2 I)^-1 tau_z,   G = J(z)^T B.
   motors NULL: the learned inputs. With ROLN_ACTUATOR current G = J(z)^T diag(k) B, and u makes tau_z beside the offsets o.
   allocation_residual [1] (may be NULL) is the part of tau_z that the motors do not make,
       |tau_z - G u| / |tau_z| = mu^2 |y| / |tau_z|,   0 if tau_z is 0
   u and allocation_residual are untouched unless ROLN_OK; u may be tau_z. ROLN_E_LENGTH: no motors, or joints are driven or have
   servos. ROLN_E_NOT_SPD: they do not span z, to within rounding, and mu does not make up for it. ROLN_E_NOT_FINITE: z, G or y is
   not, or n |G| |y| overflows.
   Nothing is squared: y = R^-1 R^-T tau_z with R the triangle of [mu I; G^T]. The rest of tau_z gives a correction of y, and a
   second one where motors are nearly parallel, which leaves a hundredth at most (test_feedback.c: test_near_motors). Cost: 3 count
   NAME_reduce, 5 where motors are nearly parallel. */
ROLN_FN roln_status ROLN_(allocate)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_motors *motors,
                                    const roln_real tau_z[ROLN_AT_LEAST(ROLN_(n))], roln_real *u, roln_real *allocation_residual,
                                    ROLN_(allocate_work) *w)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const int n = ROLN_(n);
    const roln_motors f = ROLNI_(motors_of)(p, motors);
    roln_real *const x = w->x, *const g = w->g, *const y = w->y, *const rest = w->rest, *const R = w->R;
    roln_real top = 0, left = 0; /* largest number of G */
    int last = 4, parts = 0, pass, j, i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (f.count < 1 || ROLN_(servo) || ROLN_(driven) > 0) return ROLN_E_LENGTH;
    if (!roln_all_finite(n, s->z)) return ROLN_E_NOT_FINITE;
    rolni_zero(n * n, R);
    for (i = 0; i < n; i++)
        R[i * (n + 1)] = f.mu;
    roln_ae_decode(ae, 1, 1, p->theta, s->z, NULL, w->tape);
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    tau_z = ROLNI_(beside_offsets)(p, tau_z, w);
#endif
    for (pass = 0; pass <= last; pass++) { /* 0: R, then y; 1 .. last - 1: the rest of tau_z; last: u */
        if (pass == last) { /* nothing is read or fails behind the first u */
            if (!roln_finite(ROLNI_AS(roln_real, parts * n) * top * rolni_largest(parts * n, y))) return ROLN_E_NOT_FINITE;
            rolni_zero(n, x);
            for (i = 0; i < parts * n; i++)
                x[i % n] += y[i];
            left = rolni_allocation_residual(n, tau_z, x, f.mu);
        } else rolni_copy(n, tau_z, rest);
        for (j = 0; j < f.count; j++) {
            roln_real torque = 0;
            ROLNI_(motor)(p, &f, j, x);
            roln_ae_reduce(ae, 1, p->theta, w->tape, x, g, w->u.reduce);
            for (i = 0; i < parts; i++)
                torque += roln_dot(n, g, y + i * n);
            if (pass == 0) top = ROLN_MAX(top, rolni_largest(n, g));
            if (pass == 0) rolni_copy(n, g, R + n * n), roln_qr_r(n + 1, n, R, w->u.triangle);
            else if (pass == last) u[j] = torque;
            else if (!roln_finite(torque)) return ROLN_E_NOT_FINITE;
            for (i = 0; i < n; i++)
                rest[i] -= torque * g[i];
        }
        for (i = 0; i < parts * n; i++)
            rest[i % n] -= f.mu * y[i] * f.mu;
        if (pass == 0) {
            if (!roln_all_finite(n * n, R)) return ROLN_E_NOT_FINITE;
            if (!rolni_spans(n, f.count, R)) return ROLN_E_NOT_SPD;
        }
        if (pass == 1 && rolni_largest(n, rest) <= ROLN_SQRT(ROLN_EPS) / 4 * rolni_largest(n, tau_z)) last = 2;
        if (pass == 3 && rolni_largest(n, y) > 0 && !(rolni_largest(n, rest) <= rolni_largest(n, tau_z) / 100))
            return ROLN_E_NOT_SPD;
        if (pass > 2 || pass == last) continue;
        rolni_copy(n, rest, y + parts * n);
        rolni_solve_square(n, R, y + parts * n);
        if (!roln_all_finite(n, y + parts * n)) return ROLN_E_NOT_FINITE;
        parts++;
    }
    if (allocation_residual) *allocation_residual = left;
    return ROLN_OK;
}

/* Returns z for a comparison with the range of coordinate i. The range of an angle is an arc: z gets the turn that is next to the
   middle of the arc, and an arc of 2 pi holds every z. NaN: an angle more than 2^20 rad from that middle. */
ROLN_FN roln_real ROLNI_(turned)(const ROLN_(params) *p, int i, roln_real z)
{
    return roln_lnn_near(&ROLN_(model).lnn, i, p->z_min[i] / 2 + p->z_max[i] / 2, z);
}

/* Nonzero if p holds a range: something moved in the recordings of NAME_fit_range. */
ROLN_FN int ROLNI_(has_range)(const ROLN_(params) *p)
{
    int i, has = 0;
    for (i = 0; i < ROLN_(n); i++)
        has |= p->z_max[i] > p->z_min[i] || p->zd_max[i] > 0;
    return has;
}

/* Nonzero if z [n] is at most margin (z_max - z_min) beyond the range, and |zd| <= (1 + margin) zd_max. NaN is outside, and without
   a range everything. An angle may be beyond by the rounding of its turns. */
ROLN_FN int ROLNI_(in_range)(const ROLN_(params) *p, roln_real margin, const roln_real *z, const roln_real *zd)
{
    int i, in = ROLNI_(has_range)(p);
    for (i = 0; i < ROLN_(n); i++) {
        const roln_real rounding = roln_lnn_angle(&ROLN_(model).lnn, i) ? 4 * ROLN_EPS * (ROLNI_PI + ROLN_ABS(z[i])) : 0;
        const roln_real x = ROLNI_(turned)(p, i, z[i]), room = margin * (p->z_max[i] - p->z_min[i]) + rounding;
        in &= roln_finite(z[i]) && roln_finite(zd[i]);
        in &= p->z_min[i] - x <= room;
        in &= x - p->z_max[i] <= room;
        in &= ROLN_ABS(zd[i]) <= (1 + margin) * p->zd_max[i];
    }
    return in;
}

/* t [NAME_terms] of a state: 1; x, what the networks see of z, but with the range of what is no angle as -1 .. 1; polynomials of x,
   those of one number of it alone up to degree 6 at least: what lies outside of one is to show among many; v = zd / zd_max; and
   with up to 8 coordinates all v_i x_j and v_i v_j: M, V and R may be any functions of z, but forces are quadratic in zd. */
ROLN_FN void ROLNI_(terms_of)(const ROLN_(params) *p, const roln_real *z, const roln_real *zd, roln_real *t)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int n = ROLN_(n), into = ROLN_(net_inputs);
    roln_real *const x = t + 1, *const v = x + into + ROLN_(of_x), *more = v - into * (ROLN_(degree_x) - ROLN_(degree_z));
    int i, j;
    t[0] = 1;
    if (lnn->angles) rolni_see(lnn, 1, z, x);
    for (i = 0; i < n; i++) {
        if (!roln_lnn_angle(lnn, i)) x[i] = (2 * z[i] - p->z_max[i] - p->z_min[i]) / (p->z_max[i] - p->z_min[i]);
        v[i] = zd[i] / p->zd_max[i];
    }
    rolni_polynomials(into, ROLN_(degree_z), 1, x, 0, x + into, 0);
    for (i = 0; i < into; i++) {
        roln_real last = 1, now = x[i], next;
        for (j = 2; j <= ROLN_(degree_x); j++, last = now, now = next) {
            next = 2 * x[i] * now - last;
            if (j > ROLN_(degree_z)) *more++ = next;
        }
    }
    for (more = v + n, i = 0; i < n && ROLN_(squared); i++) {
        for (j = 0; j < into; j++)
            *more++ = v[i] * x[j];
        for (j = 0; j <= i; j++)
            *more++ = v[i] * v[j];
    }
}

/* Novelty of a state by L of NAME_evidence. t [NAME_terms]: scratch. */
ROLN_FN roln_real ROLNI_(novelty)(const ROLN_(params) *p, const roln_real *L, const roln_real *z, const roln_real *zd, roln_real *t)
{
    ROLNI_(terms_of)(p, z, zd, t);
    return rolni_novelty(ROLN_(terms), L, t);
}

/* Nonzero if z and zd lie in the range seen in training; NaN does not. */
ROLN_FN int ROLN_(in_range)(const ROLN_(params) *p, const ROLN_(latent) *s)
{
    return !ROLN_(params_mismatch)(p) && ROLNI_(in_range)(p, 0, s->z, s->zd);
}

/* The measured state `at`, its latent state s, NULL if the encoder failed, the decoded state x [2N] = [phi(z); J zd], and the
   balance there, NULL if it is not known. x and the balance are read where a limit asks for them. */
typedef struct {
    const ROLN_(state) *at;
    const ROLN_(latent) *s;
    const roln_real *x;
    const rolni_balance *balance;
} ROLNI_(seen);

/* The faults of a tick but for energy and expiry, and ROLN_CLIPPED; tau: torque of the last tick. t [NAME_terms]: scratch. */
ROLN_FN uint32_t ROLNI_(faults)(const ROLN_(params) *p, const roln_limits *limits, const ROLNI_(seen) *seen, const roln_real *want,
                                const roln_real *tau, roln_real *t)
{
    const int N = ROLN_(N), nu = rolni_torques(&ROLN_(model), limits->motors);
    const roln_real *q = seen->at->q, *qd = seen->at->qd;
    uint32_t faults = 0;
    int i;
    if (!roln_all_finite(N, q) || !roln_all_finite(N, qd)) faults |= ROLN_FAULT_INPUT;
    if (!rolni_limits_valid(limits, nu) || !rolni_motors_valid(&ROLN_(model), limits->motors)) faults |= ROLN_FAULT_INPUT;
    if (ROLN_(driven) > 0 && limits->residual > 0) faults |= ROLN_FAULT_INPUT; /* the power of their drives is not known */
    if (!want || !seen->s) faults |= ROLN_FAULT_STATUS;
    if (want && !roln_all_finite(nu, want)) faults |= ROLN_FAULT_OUTPUT;
    for (i = 0; want && !(faults & (ROLN_FAULT_OUTPUT | ROLN_FAULT_INPUT)) && i < nu; i++) {
        const roln_real most = rolni_clip(limits, i, rolni_last(limits, i, tau[i]), want[i]);
        if (most < want[i] || most > want[i]) faults |= limits->strict ? ROLN_FAULT_LIMIT : ROLN_CLIPPED;
    }
    if (!seen->s) return faults;
    if (rolni_limits_decode(limits) && !(faults & ROLN_FAULT_INPUT)) {
        if (!roln_all_finite(2 * N, seen->x)) faults |= ROLN_FAULT_STATUS;
        else if (!(ROLN_(model).lnn.angles ? rolni_near_turned(&ROLN_(model).lnn, q, seen->x, limits->q_tolerance)
                                               : rolni_all_within(N, q, seen->x, limits->q_tolerance)) ||
                 !rolni_all_within(N, qd, seen->x + N, limits->qd_tolerance))
            faults |= ROLN_FAULT_MANIFOLD;
    }
    if (!ROLNI_(in_range)(p, limits->margin, seen->s->z, seen->s->zd) ||
        (limits->evidence && !(ROLNI_(novelty)(p, limits->evidence, seen->s->z, seen->s->zd, t) <= limits->novelty)))
        faults |= ROLN_FAULT_RANGE;
    return faults;
}

/* Power qd^T tau of a force in [force_size], or of motors, at = [q; qd] [2N] in. x [N]: scratch, written with inputs only. */
ROLN_FN roln_real ROLNI_(power)(const ROLN_(params) *p, const roln_motors *motors, const roln_real *in, const roln_real *at,
                                roln_real *x)
{
    const int N = ROLN_(N);
    const roln_real *const qd = at + N;
    roln_real power = 0;
    int i;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    (void)x;
    for (i = 0; i < N; i++) {
        const roln_real u = motors ? roln_dot(motors->count, motors->B + i * motors->count, in) : in[i];
        power += qd[i] * ROLNI_(actuator_torque)(p, i, u, at[i], qd[i]);
    }
#else
    if (!motors || ROLN_(inputs) > 0) {
        const roln_real *tau = ROLNI_(joint_force)(p, 1, in, x);
        if (ROLN_(inputs) > 0) rolni_divide_each(1, N, ROLNI_EACH(p), x);
        return roln_dot(N, tau, qd);
    }
    for (i = 0; i < N; i++)
        power += qd[i] * roln_dot(motors->count, motors->B + i * motors->count, in);
#endif
    return power;
}

/* NAME_guard_tick on what was seen. x [NAME_guard_x]: scratch. */
ROLN_FN uint32_t ROLNI_(guard)(const ROLN_(params) *p, const roln_limits *limits, const ROLNI_(seen) *seen, const roln_real *want,
                               ROLN_(guard) *guard, roln_real *x)
{
    const roln_motors *motors = limits->motors;
    const int counted = rolni_motors_counted(&ROLN_(model), motors);
    const int nu = counted ? rolni_torques(&ROLN_(model), motors) : ROLN_(force_size);
    const rolni_balance *b = seen->balance;
    roln_guard *g = &guard->g;
    roln_real *tau = guard->tau;
    roln_limits own;
    uint32_t faults = g->faults & ROLN_FAULT_EXPIRED, bad;
    int i, known = 0;
    if (g->bad < 0) faults |= ROLN_FAULT_EXPIRED; /* stored twice: a flipped bit does not restart the motors */
    if (!counted) own = rolni_limits_uncounted(limits), limits = &own, want = NULL, faults |= ROLN_FAULT_INPUT;
    faults |= ROLNI_(faults)(p, limits, seen, want, tau, x);
    if (limits->residual > 0 && !(faults & (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | ROLN_FAULT_RANGE | ROLN_FAULT_MANIFOLD))) {
        /* at the end of the last tick, under its torque */
        const roln_real before = b ? ROLNI_(power)(p, motors, ROLNI_ACTING(guard), seen->x, x) - b->lost : 0;
        known = b && roln_finite(b->energy) && roln_finite(before);
        if (!known) faults |= ROLN_FAULT_STATUS;
        else if (g->valid && rolni_unbalanced(limits, b, before, g)) faults |= ROLN_FAULT_ENERGY;
    }
    bad = faults & ~ROLNI_AS(uint32_t, ROLN_CLIPPED);
    if (bad) faults = bad; /* what was wanted does not reach the motors */
    if (bad && g->bad >= limits->hold) faults |= ROLN_FAULT_EXPIRED;
    if ((bad & ROLN_FAULT_ENERGY) && limits->false_alarms > 0 && g->alarms > ROLNI_AS(uint32_t, limits->hold))
        faults |= ROLN_FAULT_EXPIRED;
    g->bad = faults & ROLN_FAULT_EXPIRED ? -1 : bad ? g->bad + 1 : 0;
#if ROLN_DELAY > 0
    for (i = 0; i < ROLN_(delay); i++) /* the torque of the last tick is on its way, whatever comes of this one */
        rolni_copy(ROLN_(force_size), ROLNI_COMING(guard, i), guard->sent[i]);
#endif
    for (i = 0; i < nu; i++) { /* want is there, unless bad */
        const roln_real last = rolni_last(limits, i, tau[i]);
        tau[i] = !bad ? rolni_clip(limits, i, last, want[i]) : faults & ROLN_FAULT_EXPIRED ? rolni_safe(limits, i) : last;
    }
    g->valid = 0;
    if (known) { /* start of the next tick, under the new torque */
        const roln_real after = ROLNI_(power)(p, motors, ROLNI_ACTING(guard), seen->x, x) - b->lost;
        if (roln_finite(after)) g->valid = 1, g->energy = b->energy, g->power = after;
    }
    g->faults |= faults;
    return faults;
}

/* scratch of NAME_guard_tick: decoded = [phi(z); J zd]; s = [z; zd] in units of the networks */
typedef struct {
    roln_real decoded[2 * ROLN_(N)], s[2 * ROLN_(n)];
    union {
        roln_real decode[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))], x[ROLN_(guard_x)];
        struct {
            roln_real tape[ROLN_LNN_TAPE(ROLN_, 1, 0, 1)];
            roln_real work[ROLN_MAX(ROLN_(guard_net_work), 2 * ROLN_(n))];
        } net;
    } u;
} ROLN_(guard_tick_work);

/* NAME_guard_tick where a load [n] is known, NULL: none. */
ROLN_FN uint32_t ROLNI_(judge)(const ROLN_(params) *p, const roln_limits *limits, const ROLN_(state) *x, const ROLN_(latent) *s,
                               const roln_real *want, const roln_real *load, ROLN_(guard) *g, ROLN_(guard_tick_work) *w)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    rolni_balance b = {0, 0};
    ROLNI_(seen) seen;
    if (ROLN_(params_mismatch)(p)) s = NULL;
    seen.at = x, seen.s = s, seen.x = w->decoded, seen.balance = NULL;
    if (s && rolni_limits_decode(limits)) (void)ROLNI_(decode)(p, s->z, s->zd, w->decoded, w->u.decode, w->s);
    if (s && want && limits->residual > 0) {
        const rolni_tape t = rolni_tape_of(lnn, 1, 0, 1, w->u.net.tape);
        ROLNI_(net_state)(p, s->z, s->zd, w->s);
        if (rolni_eval(lnn, 0, 1, ROLNI_(net)(p), w->s, NULL, ROLNI_ALL_OF_D(ROLN_FRICTION), w->u.net.tape, w->u.net.work) ==
            ROLN_OK) {
            b = ROLNI_(balance)(p, &t, s->zd, w->u.net.work);
            if (load) b.lost -= roln_dot(ROLN_(n), s->zd, load);
            seen.balance = &b;
        }
    }
    return ROLNI_(guard)(p, limits, &seen, want, g, w->u.x);
}

/* The guard: last call of a control tick, after the controller. Call it once a tick.
   Arguments: x was measured. s is its latent state, NULL if the encoder failed or there is no estimate. `want` [force_size], of
   limits->motors [count], is to be applied from now on, NULL if a function on the way to it failed. If the motors do not fit the
   model, neither `want` nor an array of torques of the limits is read. g->tau is the torque of the last tick in and that of this
   tick out.
   Verdict: if all is well g->tau becomes `want`, each joint clipped to its limits of torque and rate (ROLN_CLIPPED). Else it stays,
   at most limits->hold times in a row. Then it is the safe torque, at once, until g->g is zeroed. A last torque beyond its limit
   counts as 0: a limit that falls has to fall no faster than the rate. Returns the faults of this tick, ROLN_FAULT_.., or
   ROLN_CLIPPED; g->g.faults keeps those of all ticks. Parameters that do not match count as an encoder that failed.
   Delay: with ROLN_DELAY x and s are as measured all the same, not ahead. The guard compares them with the torques that act,
   g->sent[0]. Each call adds a torque to those on their way.
   Energy residual: r = (energy gained since the last tick) / dt - (mean of zd^T (J^T tau - d) at both ends). r is known if neither
   tick has ROLN_FAULT_INPUT, _STATUS, _RANGE or _MANIFOLD, with which z is not the pose. r is of second order in dt and grows
   with every external force that the model does not know. A velocity that jumps from tick to tick, of an encoder, say, lets r jump
   by the energy of the jump over dt. With limits->residual_window = w the running mean R += (r - R) / w takes the place of r: jumps
   count a w-th, and a force that stays counts after w ticks. With limits->false_alarms = a it is the mean of w ticks whose r is
   known: one beyond the limit is an alarm and a bad tick, and the limit follows (rolni_raised). More than `hold` alarms in a row
   (rolni_alarm) expire the guard, too. */
ROLN_FN uint32_t ROLN_(guard_tick)(const ROLN_(params) *p, const roln_limits *limits, const ROLN_(state) *x,
                                   const ROLN_(latent) *s, const roln_real *want, ROLN_(guard) *g, ROLN_(guard_tick_work) *w)
{
    return ROLNI_(judge)(p, limits, x, s, want, NULL, g, w);
}

#if ROLN_DELAY == 0
/* scratch of NAME_tick */
typedef union {
    ROLN_(encode_work) encode; /* done before decoded is written */
    struct {
        roln_real decoded[2 * ROLN_(N)], tau[ROLN_(N)], tau_z[ROLN_(n)];
        union {
            struct {
                roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))]; /* of the decoder, for the lift */
                union {
                    roln_real s[2 * ROLN_(n)], lift[ROLNI_ROOM(ROLN_AE_LIFT_WORK(ROLN_, 1))];
                    ROLN_(control_work) control;
                } u;
            } lift;
            ROLN_(allocate_work) allocate;
            roln_real x[ROLN_(guard_x)]; /* of the guard */
        } u;
    } rest;
} ROLN_(tick_work);

/* All of a control tick: x measured, s its latent state out (as it was if the encoder fails), g->tau to the motors. NAME_encode,
   NAME_control, NAME_lift and NAME_guard_tick in one call, the same bits, but the state is decoded once and the networks are
   evaluated once. If limits->motors or learned inputs are to make tau_z, NAME_allocate takes the place of NAME_lift, and
   g->g.allocation_residual is the part of tau_z that they cannot make. The energy residual counts on r->load, of which
   NAME_guard_tick by itself does not know. Returns the faults of this tick, ROLN_FAULT_.., or ROLN_CLIPPED. With ROLN_DELAY:
   below. */
ROLN_FN uint32_t ROLN_(tick)(const ROLN_(params) *p, const roln_limits *limits, const ROLN_(state) *x, const ROLN_(target) *r,
                             ROLN_(latent) *s, ROLN_(guard) *g, ROLN_(tick_work) *w)
{
    rolni_balance b = {0, 0};
    ROLNI_(seen) seen;
    roln_real *const tau = w->rest.tau, *const tau_z = w->rest.tau_z;
    roln_status st = ROLN_(encode)(p, x, s, &w->encode);
    seen.at = x, seen.s = NULL, seen.x = w->rest.decoded, seen.balance = NULL;
    if (st == ROLN_OK) {
        seen.s = s;
        st = ROLNI_(decode)(p, s->z, s->zd, w->rest.decoded, w->rest.u.lift.tape, w->rest.u.lift.u.s);
    }
    if (st == ROLN_OK && !rolni_motors_valid(&ROLN_(model), limits->motors)) st = ROLN_E_SHAPE;
    if (st == ROLN_OK) st = ROLNI_(control)(p, s, r, tau_z, &b, &w->rest.u.lift.u.control);
    if (st == ROLN_OK) seen.balance = &b;
    if (st == ROLN_OK && !limits->motors && ROLN_(inputs) == 0)
        st = ROLNI_(lift)(p, 2, w->rest.u.lift.tape, tau_z, w->rest.decoded, tau, w->rest.u.lift.u.lift);
    else if (st == ROLN_OK) st = ROLN_(allocate)(p, s, limits->motors, tau_z, tau, &g->g.allocation_residual, &w->rest.u.allocate);
    return ROLNI_(guard)(p, limits, &seen, st == ROLN_OK ? tau : NULL, g, w->rest.u.x);
}
#endif /* NAME_tick with ROLN_DELAY: behind NAME_step, with which it looks ahead */

/* ---- 11 prediction and mechanics ------------------------------------------------------------- */

/* A held force as the integrators ask for it (roln_force), and its scratch for nb states: on z it acts as J(z)^T tau, tau = in or
   B in, or that of actuators. */
typedef struct {
    const ROLN_(params) *p;
    const roln_real *in;         /* [nb][force_size], in units of the networks */
    roln_real *tau;              /* [nb][N] with inputs: B in; with actuators their force, of servos behind it q, qd */
    roln_real *tape, *work;      /* of eval */
    roln_real *gae, *gB;         /* of bwd: gradients of the autoencoder, of B [N][inputs] or of actuators; NULL: not wanted */
    roln_real *g, *bwd;          /* its scratch: cotangents [nb][N] of tau, and of q, qd behind it, as tau, or y without driven
                                    coordinates [nb][n]; work */
    roln_real *T, *u, *jac;      /* scratch of jac: [n][N], [n][inputs], work */
} ROLNI_(torque);

/* Of servos q, qd [nb][N] at z, zd [nb][n] to their place behind tau. tape of 2-jets. */
ROLN_FN void ROLNI_(servo_at)(const ROLNI_(torque) *f, int nb, const roln_real *z, roln_real *tape)
{
    if (ROLN_(servo)) roln_ae_decode(&ROLN_(model).ae, 2, nb, f->p->theta, z, f->tau + nb * ROLN_(N), tape);
}

/* tau_z = J(z)^T tau; of driven coordinates the acceleration, which no tau makes: rows of J that belong to driven joints are 0 but
   for theirs. */
ROLN_FN void ROLNI_(torque_eval)(void *ctx, int nb, const roln_real *z, roln_real *tau_z)
{
    const ROLNI_(torque) *f = ROLNI_AS(const ROLNI_(torque) *, ctx);
    const roln_ae *ae = &ROLN_(model).ae;
    const int N = ROLN_(N), n = ROLN_(n);
    int r, i;
    ROLNI_(servo_at)(f, nb, z, f->tape);
    roln_ae_decode(ae, 1, nb, f->p->theta, z, NULL, f->tape);
    roln_ae_reduce(ae, nb, f->p->theta, f->tape, ROLNI_(joint_force)(f->p, nb, f->in, f->tau), tau_z, f->work);
    for (r = 0; r < nb; r++)
        for (i = n - ROLN_(keeps); i < n; i++)
            tau_z[r * n + i] = ROLNI_(driven_slope)(f->p, i) * f->in[(r + 1) * N - n + i];
}

/* The driven coordinates of x [rows][n] become 0: the forces that drive them are not known. */
ROLN_FN void ROLNI_(drop_driven)(int rows, roln_real *x)
{
    int r;
    for (r = 1; r <= rows && ROLN_(driven) > 0; r++)
        rolni_zero(ROLN_(driven), x + r * ROLN_(n) - ROLN_(driven));
}

/* Its backward for the cotangent y [nb][n] of tau_z: adds to gz [nb][n] and, if params, to gae and gB. */
ROLN_FN void ROLNI_(torque_bwd)(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz)
{
    const ROLNI_(torque) *f = ROLNI_AS(const ROLNI_(torque) *, ctx);
    const int N = ROLN_(N), inputs = ROLN_(inputs), learned = inputs > 0 || ROLN_(actuator) > 0;
    if (learned) rolni_zero(nb * N, f->g);
    if (ROLN_(keeps) > 0) {
        rolni_copy(nb * ROLN_(n), y, f->g);
        ROLNI_(drop_driven)(nb, f->g);
        y = f->g;
    }
    ROLNI_(servo_at)(f, nb, z, f->bwd);
    roln_ae_reduce_bwd(&ROLN_(model).ae, nb, f->p->theta, z, ROLNI_(joint_force)(f->p, nb, f->in, f->tau), y, gz,
                       learned ? f->g : NULL, params ? f->gae : NULL, f->bwd);
    if (inputs > 0 && params) roln_mm_at(N, nb, inputs, f->g, f->in, f->gB);
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    ROLNI_(actuate_bwd)(f->p, nb, f->in, f->tau, f->g, params ? f->gB : NULL);
#endif
    if (ROLN_(servo)) { /* back from q, qd; the tape, and work behind it, are no longer than those of the reduction */
        ROLNI_(servo_at)(f, nb, z, f->bwd);
        roln_ae_decode_bwd(&ROLN_(model).ae, 2, nb, f->p->theta, f->bwd, f->g + nb * N, gz, params ? f->gae : NULL,
                           f->bwd + ROLN_AE_DECODE_TAPE(ROLN_, 2, nb));
    }
}

#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
/* Servos add their derivatives by q to H [n][n] of ROLNI_(torque_jac): each row of T = J^T goes back through the decoder. work
   [ROLNI_SERVO_JAC_WORK]. */
ROLN_FN void ROLNI_(servo_jac)(const ROLNI_(torque) *f, const roln_real *z, roln_real *H, roln_real *work)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_real *const g = work, *const gs = g + 2 * N, *const tape = gs + 2 * n;
    int i, j;
    ROLNI_(servo_at)(f, 1, z, tape);
    for (i = 0; i < n; i++) {
        for (j = 0; j < N; j++) {
            roln_real d;
            const roln_real k = ROLNI_(actuator_slope)(f->p, j, &d);
            g[j] = -k * f->T[i * N + j], g[N + j] = -d * f->T[i * N + j];
        }
        rolni_zero(2 * n, gs);
        roln_ae_decode_bwd(&ROLN_(model).ae, 2, 1, f->p->theta, tape, g, gs, NULL, tape + ROLN_AE_DECODE_TAPE(ROLN_, 2, 1));
        for (j = 0; j < n; j++)
            H[j * n + i] += gs[j];
    }
}

/* The derivative of the force of servos by zd, -J^T diag(d) J, with T of the call of ROLNI_(torque_jac) before. */
ROLN_FN void ROLNI_(torque_jac_zd)(void *ctx, const roln_real *z, roln_real *H)
{
    const ROLNI_(torque) *f = ROLNI_AS(const ROLNI_(torque) *, ctx);
    const int N = ROLN_(N), n = ROLN_(n);
    int i, j, a;
    (void)z;
    rolni_zero(n * n, H);
    for (a = 0; a < N; a++) {
        roln_real d;
        (void)ROLNI_(actuator_slope)(f->p, a, &d);
        for (j = 0; j < n; j++)
            for (i = 0; i < n; i++)
                H[j * n + i] -= d * f->T[i * N + a] * f->T[j * N + a];
    }
}
#endif

/* Its derivatives at one z: H [n][n] and, unless it is NULL, G [force_size][n], which is J or, with inputs, B^T J, or with
   actuators diag(k) J. */
ROLN_FN void ROLNI_(torque_jac)(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
{
    const ROLNI_(torque) *f = ROLNI_AS(const ROLNI_(torque) *, ctx);
    const int N = ROLN_(N), n = ROLN_(n), inputs = ROLN_(inputs), size = ROLN_(force_size);
    const roln_real *B = f->p->theta + ROLN_(theta_size) - ROLN_(input_size);
    int i, j;
    ROLNI_(servo_at)(f, 1, z, f->jac);
    roln_ae_reduce_jac(&ROLN_(model).ae, f->p->theta, z, ROLNI_(joint_force)(f->p, 1, f->in, f->tau), f->T, H, f->jac);
    if (G && inputs > 0) roln_mm(n, N, inputs, f->T, B, f->u);
    for (i = 0; G && i < size; i++)
        for (j = 0; j < n; j++)
            G[i * n + j] = (inputs > 0 ? f->u : f->T)[j * size + i];
    for (i = n - ROLN_(keeps); i < n; i++)
        for (j = 0; j < N; j++) {
            if (j < n) H[j * n + i] = 0;
            if (G) G[j * n + i] = j == N - n + i ? ROLNI_(driven_slope)(f->p, i) : 0;
        }
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    for (i = 0; G && i < size; i++) {
        roln_real d;
        const roln_real k = ROLNI_(actuator_slope)(f->p, i, &d);
        for (j = 0; j < n; j++)
            G[i * n + j] *= k;
    }
#endif
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
    ROLNI_(servo_jac)(f, z, H, f->jac);
#endif
}

/* The network with a held force on it, and all that hangs on it. It stays where it is. */
typedef struct {
    roln_system sys; /* for the integrators; sys.force NULL: no force */
    roln_force force;
    ROLNI_(torque) torque;
} ROLNI_(forced);

/* Scratch of the force on one state, and of its derivatives. */
typedef struct {
    roln_real tau[ROLNI_ROOM(ROLNI_TAU(ROLN_, 1))], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1 + ROLN_(servo), 1))];
    roln_real work[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, 1))];
} ROLNI_(force_work);
typedef union {
    struct {
        roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1 + ROLN_(servo), 1))];
        roln_real work[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, 1))];
    } eval;
    /* T [n][N], u [n][inputs], work */
    roln_real jac[ROLN_(n) * (ROLN_(N) + ROLN_(inputs)) + ROLN_MAX(ROLN_AE_REDUCE_JAC_WORK(ROLN_), ROLNI_SERVO_JAC_WORK(ROLN_))];
} ROLNI_(force_jac_work);

/* in [nb][force_size], NULL: no force; tau, tape, work: scratch. Gradients need force.bwd and its scratch, derivatives force.jac: a
   function that is not named here is not in programs without them. */
ROLN_FN void ROLNI_(hold_force)(const ROLN_(params) *p, const roln_real *in, roln_real *tau, roln_real *tape, roln_real *work,
                                ROLNI_(forced) *d)
{
    d->torque.p = p, d->torque.in = in, d->torque.tau = tau, d->torque.tape = tape, d->torque.work = work;
    d->force.eval = ROLNI_(torque_eval), d->force.bwd = NULL, d->force.jac = NULL, d->force.ctx = &d->torque;
    d->force.jac_zd = NULL;
    d->sys.theta = ROLNI_(net)(p), d->sys.force = in ? &d->force : NULL;
}

/* scratch of NAME_reduce */
typedef struct {
    roln_real out[ROLN_(n)];
    roln_real tau[ROLNI_ROOM((ROLN_(own) > 0 || ROLN_(actuator) > 0) * ROLN_(force_size))]; /* in units of the joints */
    ROLNI_(force_work) force;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    roln_real s[2 * ROLN_(n)]; /* [z; zd] in units of the networks */
#endif
} ROLN_(reduce_work);

/* tau_z = J(z)^T tau [n] of a force tau [N], of inputs through B, or of the inputs of actuators. That of servos depends on z and
   zd. Of a driven joint tau and tau_z are accelerations.
   tau_z is untouched unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(reduce)(const ROLN_(params) *p, const ROLN_(latent) *s,
                                  const roln_real tau[ROLN_AT_LEAST(ROLN_(force_size))],
                                  roln_real tau_z[ROLN_AT_LEAST(ROLN_(n))], ROLN_(reduce_work) *w)
{
    const int n = ROLN_(n), own = ROLN_(own), size = ROLN_(force_size);
    ROLNI_(forced) d;
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    (void)own;
    ROLNI_(net_state)(p, s->z, s->zd, w->s);
    for (i = 0; i < size; i++)
        w->tau[i] = tau[i] * ROLNI_(input_unit)(p);
    ROLNI_(own_inputs)(p, 1, w->tau);
    ROLNI_(hold_force)(p, w->tau, w->force.tau, w->force.tape, w->force.work, &d);
    ROLNI_(torque_eval)(&d.torque, 1, w->s, w->out);
    for (i = 0; i < n; i++)
        w->out[i] *= p->scale.m / (p->scale.t * p->scale.t);
#else
    if (own) rolni_copy(size, tau, w->tau), rolni_multiply_each(1, size, ROLNI_(force_units)(p), w->tau);
    ROLNI_(hold_force)(p, own ? w->tau : tau, w->force.tau, w->force.tape, w->force.work, &d);
    ROLNI_(torque_eval)(&d.torque, 1, s->z, w->out);
    for (i = 0; i < n; i++)
        w->out[i] *= p->scale.q;
    for (i = n - ROLN_(driven); i < n; i++)
        w->out[i] = tau[ROLN_(N) - n + i] * ROLNI_(driven_unit)(p, i);
#endif
    if (!roln_all_finite(n, w->out) || !roln_all_finite(n, s->z)) return ROLN_E_NOT_FINITE; /* z: tanh of it is finite */
    rolni_copy(n, w->out, tau_z);
    return ROLN_OK;
}

/* A torque and a load of one state as the integrators ask for them: J(z)^T tau + unit load. by_load: the derivatives are by the
   load, I, else by the torque. */
typedef struct {
    ROLNI_(torque) *torque;
    const roln_real *load;
    roln_real unit;
    int by_load;
} ROLNI_(loaded);

ROLN_FN void ROLNI_(loaded_eval)(void *ctx, int nb, const roln_real *z, roln_real *tau_z)
{
    const ROLNI_(loaded) *f = ROLNI_AS(const ROLNI_(loaded) *, ctx);
    int i;
    ROLNI_(torque_eval)(f->torque, nb, z, tau_z);
    for (i = 0; i < ROLN_(n); i++)
        tau_z[i] += f->unit * f->load[i];
}

ROLN_FN void ROLNI_(loaded_jac)(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
{
    const ROLNI_(loaded) *f = ROLNI_AS(const ROLNI_(loaded) *, ctx);
    const int n = ROLN_(n);
    int i;
    ROLNI_(torque_jac)(f->torque, z, H, f->by_load ? NULL : G);
    for (i = 0; i < n * n && G && f->by_load; i++)
        G[i] = i % (n + 1) == 0;
}

#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
ROLN_FN void ROLNI_(loaded_jac_zd)(void *ctx, const roln_real *z, roln_real *H)
{
    ROLNI_(torque_jac_zd)(ROLNI_AS(const ROLNI_(loaded) *, ctx)->torque, z, H);
}
#endif

/* The load [n] joins the force of d; all stay where they are. NULL: nothing is done. */
ROLN_FN void ROLNI_(hold_load)(const ROLN_(params) *p, const roln_real *load, int by_load, ROLNI_(forced) *d, ROLNI_(loaded) *f)
{
    if (!load) return;
    f->torque = &d->torque, f->load = load, f->unit = p->scale.t * p->scale.t / p->scale.m, f->by_load = by_load;
    d->force.eval = ROLNI_(loaded_eval), d->force.ctx = f;
}

/* The state and the force of a step, in units of the networks. */
typedef struct {
    roln_real s[2 * ROLN_(n)], held[ROLN_(force_size)];
    ROLNI_(force_work) force;
} ROLNI_(step_base);

/* scratch of NAME_step */
typedef struct {
    ROLNI_(step_base) base;
    roln_real tape[ROLN_LNN_TAPE(ROLN_, 1, 0, 1)], work[ROLN_(advance_1)];
} ROLN_(step_work);

/* One step of h of the states s [2][nb][n], in units of the networks, in place: roln_lnn_step, with ROLN_STICTION
   roln_lnn_stick. */
ROLN_FN roln_status ROLNI_(advance)(const roln_system *sys, int nb, roln_real h, roln_real *s, roln_real *tape, roln_real *work)
{
#if ROLN_STICTION > 0
    return roln_lnn_stick(&ROLNI_(sticking), sys, ROLN_(model).scheme, nb, h, s, s, tape, work);
#else
    return roln_lnn_step(&ROLN_(model).lnn, sys, ROLN_(model).scheme, 0, nb, h, s, s, tape, work);
#endif
}

/* NAME_step of z, zd under a push, with tape and work of the step. ROLNI_LOOK: a step of leapfrog, of models without
   ROLN_STICTION. */
ROLN_FN roln_status ROLNI_(step_by)(const ROLN_(params) *p, roln_real *z, roln_real *zd, const rolni_push *by,
                                    ROLNI_(step_base) *base, roln_real *tape, roln_real *work)
{
    const int n = ROLN_(n), size = ROLN_(force_size);
    const roln_real t = p->scale.t, unit = ROLNI_(input_unit)(p), h = by->dt / t;
    const int acts = by->tau || by->load || ROLN_(actuator) > 0;
    roln_real *const s = base->s, *const held = base->held;
    ROLNI_(forced) d;
    ROLNI_(loaded) loaded;
    roln_status st;
    int i;
    ROLNI_(hold_force)(p, acts ? held : NULL, base->force.tau, base->force.tape, base->force.work, &d);
    ROLNI_(hold_load)(p, by->load, 0, &d, &loaded);
    for (i = 0; i < size && acts; i++)
        held[i] = by->tau ? by->tau[i] * unit : 0;
    if (by->tau) ROLNI_(own_inputs)(p, 1, held);
    ROLNI_(net_state)(p, z, zd, s);
    if (by->how & ROLNI_TURN) rolni_turn_back(&ROLN_(model).lnn, 1, s);
    st = (ROLN_STICTION) == 0 && (by->how & ROLNI_LOOK)
             ? roln_lnn_step(&ROLN_(model).lnn, &d.sys, ROLN_LEAPFROG, 0, 1, h, s, s, tape, work)
             : ROLNI_(advance)(&d.sys, 1, h, s, tape, work);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        s[n + i] /= t;
    if (!roln_all_finite(n, s + n)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, s, z);
    rolni_copy(n, s + n, zd);
    return ROLN_OK;
}

ROLN_FN roln_status ROLNI_(step)(const ROLN_(params) *p, roln_real *z, roln_real *zd, const rolni_push *by, ROLN_(step_work) *w)
{
    return ROLNI_(step_by)(p, z, zd, by, &w->base, w->tape, w->work);
}

/* Advances s by dt seconds, one step of the model's integrator, under the force tau [N] on q (or inputs u), held over the step;
   NULL: 0. Of a driven joint tau is the acceleration. A servo follows its position u with its force at every state within the
   step. s stays as it was unless ROLN_OK. An angle that is more than two turns, 4 pi, from 0 is brought within (-pi, pi] first, so
   that motion is the same on every turn (held by test_sums.c: test_turns). With ROLN_STICTION a joint that dry friction holds has
   zd = 0 exactly and keeps its z to the bit (roln_lnn_stick); a negative dt is then ROLN_E_RANGE. Status of roln_lnn_step, with
   ROLN_STICTION of roln_lnn_stick; ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(step)(const ROLN_(params) *p, ROLN_(latent) *s, const roln_real tau[ROLN_(force_size)], roln_real dt,
                                ROLN_(step_work) *w)
{
    rolni_push by;
    by.tau = tau, by.load = NULL, by.dt = dt, by.how = ROLNI_TURN;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return ROLNI_(step)(p, s->z, s->zd, &by, w);
}

#if ROLN_DELAY > 0
/* scratch of NAME_ahead */
typedef struct {
    ROLN_(latent) s;
    roln_real tau[ROLN_(N)]; /* of motors */
    ROLN_(step_work) step;
} ROLN_(ahead_work);

/* Carries s from now to the time at which the torque of this tick acts: ROLN_DELAY steps of limits->dt, NAME_step, under the
   torques of g that are on their way, those of limits->motors if there are any. Call it between the estimate and the controller,
   before the guard. load [n]: a force on z that is known, such as that of NAME_filter, NULL: none. s stays as it was unless
   ROLN_OK. ROLN_E_SHAPE: the motors do not fit the model; status of NAME_step. Cost: ROLN_DELAY times NAME_step. */
ROLN_FN roln_status ROLN_(ahead)(const ROLN_(params) *p, const roln_limits *limits, const ROLN_(guard) *g, const roln_real *load,
                                 ROLN_(latent) *s, ROLN_(ahead_work) *w)
{
    const roln_motors *motors = limits->motors;
    rolni_push by;
    int h, i;
    if (ROLN_(params_mismatch)(p) || !rolni_motors_valid(&ROLN_(model), motors)) return ROLN_E_SHAPE;
    by.load = load, by.dt = limits->dt, by.how = ROLNI_TURN;
    w->s = *s;
    for (h = 0; h < ROLN_(delay); h++) {
        const roln_real *const coming = ROLNI_COMING(g, h);
        const int by_motors = motors && ROLN_(inputs) == 0;
        roln_status st;
        for (i = 0; i < ROLN_(N) && by_motors; i++)
            w->tau[i] = roln_dot(motors->count, motors->B + i * motors->count, coming);
        by.tau = by_motors ? w->tau : coming;
        if ((st = ROLNI_(step)(p, w->s.z, w->s.zd, &by, &w->step)) != ROLN_OK) return st;
    }
    *s = w->s;
    return ROLN_OK;
}

/* scratch of NAME_tick */
typedef struct {
    ROLN_(latent) then;
    roln_real tau[ROLN_(N)], tau_z[ROLN_(n)];
    union {
        ROLN_(encode_work) encode;
        ROLN_(ahead_work) ahead;
        ROLN_(control_work) control;
        ROLN_(lift_work) lift;
        ROLN_(allocate_work) allocate;
        ROLN_(guard_tick_work) guard_tick;
    } u;
} ROLN_(tick_work);

/* All of a control tick whose torque acts ROLN_DELAY ticks later: x measured, s its latent state out (as it was if the encoder
   fails), g->tau to be sent. NAME_encode; NAME_ahead, under r->load, too; NAME_control and NAME_lift or NAME_allocate at the state
   that is ahead; NAME_guard_tick at s. So r is the reference of the time at which the torque acts. A state ahead that is out of
   range, widened by limits->margin, is ROLN_FAULT_RANGE and ROLN_FAULT_STATUS. The energy residual counts on r->load. Returns the
   faults of this tick, ROLN_FAULT_.., or ROLN_CLIPPED. */
ROLN_FN uint32_t ROLN_(tick)(const ROLN_(params) *p, const roln_limits *limits, const ROLN_(state) *x, const ROLN_(target) *r,
                             ROLN_(latent) *s, ROLN_(guard) *g, ROLN_(tick_work) *w)
{
    const roln_status seen = ROLN_(encode)(p, x, s, &w->u.encode);
    roln_status st = seen;
    uint32_t faults = 0;
    w->then = *s;
    if (st == ROLN_OK) st = ROLN_(ahead)(p, limits, g, ROLNI_LOAD_OF(r), &w->then, &w->u.ahead);
    if (st == ROLN_OK && !ROLNI_(in_range)(p, limits->margin, w->then.z, w->then.zd)) faults = ROLN_FAULT_RANGE, st = ROLN_E_RANGE;
    if (st == ROLN_OK) st = ROLN_(control)(p, &w->then, r, w->tau_z, &w->u.control);
    if (st == ROLN_OK && !limits->motors && ROLN_(inputs) == 0) st = ROLN_(lift)(p, &w->then, w->tau_z, w->tau, &w->u.lift);
    else if (st == ROLN_OK)
        st = ROLN_(allocate)(p, &w->then, limits->motors, w->tau_z, w->tau, &g->g.allocation_residual, &w->u.allocate);
    g->g.faults |= faults;
    return faults | ROLNI_(judge)(p, limits, x, seen == ROLN_OK ? s : NULL, st == ROLN_OK ? w->tau : NULL, ROLNI_LOAD_OF(r), g,
                                  &w->u.guard_tick);
}
#endif

/* Scratch of a linearisation but for its derivatives J and the kernel's work, which grow with the columns wanted of B or L. */
typedef struct {
    roln_real s[2 * ROLN_(n)], held[ROLN_(force_size) + ROLNI_TAU(ROLN_, 1)]; /* of inputs, u and B u */
    ROLNI_(force_jac_work) force;
    roln_real tape[ROLN_JAC_TAPES(ROLNI_INT(ROLN_(scheme))) * ROLN_LNN_TAPE(ROLN_, 1, 1, 1)];
} ROLNI_(linear_base);

/* One step of h of a state s [2n], in place, and its derivatives J [2n + wanted][2n]: roln_lnn_step_jac, with ROLN_STICTION
   roln_lnn_stick_jac. how: ROLNI_SLIDE, ROLNI_LOOK. ROLNI_ADVANCE_JAC_WORK(step): numbers of work, where roln_lnn_step_jac takes
   `step`. */
#if ROLN_STICTION > 0
#define ROLNI_ADVANCE_JAC_WORK(step) ROLN_MAX(ROLN_LNN_STICK_JAC_WORK(ROLN_, step), ROLN_(advance_1))
#else
#define ROLNI_ADVANCE_JAC_WORK(step) (step)
#endif
ROLN_FN roln_status ROLNI_(advance_jac)(const roln_system *sys, int how, int wanted, roln_real h, roln_real *s, roln_real *J,
                                        roln_real *tape, roln_real *work)
{
    const int leaps = ROLN_(leaps) > 0 && (how & ROLNI_LOOK);
#if ROLN_STICTION > 0
    const roln_lnn *const f = &ROLNI_(sticking);
    const int scheme = ROLN_(model).scheme;
    roln_real from[2 * ROLN_(n)];
    roln_status st;
    (void)leaps;
    if (!(how & ROLNI_SLIDE)) return roln_lnn_stick_jac(f, sys, scheme, wanted, h, s, s, J, tape, work);
    rolni_copy(2 * ROLN_(n), s, from);
    st = roln_lnn_stick(f, sys, scheme, 1, h, s, s, tape, work);
    return st == ROLN_OK ? roln_lnn_step_jac(f, sys, scheme, wanted, h, from, from, J, tape, work) : st;
#else
    return roln_lnn_step_jac(&ROLN_(model).lnn, sys, leaps ? ROLN_LEAPFROG : ROLN_(model).scheme, wanted, h, s, s, J, tape, work);
#endif
}

/* NAME_linear of z, zd under a push; B, L of `to` NULL: not wanted. J [2n + wanted][2n], work [ROLNI_ADVANCE_JAC_WORK];
   wanted: columns of B or L. */
ROLN_FN roln_status ROLNI_(linear)(const ROLN_(params) *p, roln_real *z, roln_real *zd, const rolni_push *by,
                                   const rolni_slopes *to, ROLNI_(linear_base) *w, roln_real *J, roln_real *work)
{
    const int n = ROLN_(n), n2 = 2 * n, size = ROLN_(force_size), wanted = to->L ? n : to->B ? size : 0, rows = n2 + wanted;
    const roln_real t = p->scale.t, unit = ROLNI_(input_unit)(p), *const each = ROLNI_(force_units)(p);
    const int acts = by->tau || by->load || wanted > 0 || ROLN_(actuator) > 0;
    roln_real *const s = w->s, *const held = w->held;
    ROLNI_(forced) d;
    ROLNI_(loaded) loaded;
    roln_status st;
    int i, j;
    ROLNI_(hold_force)(p, acts ? held : NULL, held + size, w->force.eval.tape, w->force.eval.work, &d);
    d.torque.T = w->force.jac, d.torque.u = d.torque.T + n * ROLN_(N), d.torque.jac = d.torque.u + n * ROLN_(inputs);
    d.force.jac = by->load ? ROLNI_(loaded_jac) : ROLNI_(torque_jac);
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) == 2
    d.force.jac_zd = by->load ? ROLNI_(loaded_jac_zd) : ROLNI_(torque_jac_zd);
#endif
    ROLNI_(hold_load)(p, by->load, to->L != NULL, &d, &loaded);
    for (i = 0; i < size; i++)
        held[i] = by->tau ? by->tau[i] * unit : 0;
    ROLNI_(own_inputs)(p, 1, held);
    ROLNI_(net_state)(p, z, zd, s);
    if (by->how & ROLNI_TURN) rolni_turn_back(&ROLN_(model).lnn, 1, s);
    st = ROLNI_(advance_jac)(&d.sys, by->how, wanted, by->dt / t, s, J, w->tape, work);
    if (st != ROLN_OK) return st;
    for (j = 0; j < rows; j++) { /* of z, zd t by z, zd t, and by tau unit, or by load t^2 / m */
        const roln_real tj = j < n ? 1 : j < n2 ? t : to->L ? t * t / p->scale.m : unit;
        const roln_real own = j < n2 || to->L ? 1 : ROLNI_(own_input)(p, each, j - n2);
        for (i = 0; i < n2; i++) {
            roln_real *x = J + j * n2 + i;
            *x *= (i < n ? 1 : 1 / t) * tj;
            *x *= own;
        }
    }
    for (i = 0; i < n; i++)
        s[n + i] /= t;
    if (!roln_all_finite(rows * n2, J) || !roln_all_finite(n, s + n)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < n2; i++) {
        for (j = 0; j < n2; j++)
            to->A[i * n2 + j] = J[j * n2 + i];
        for (j = n2; j < rows; j++)
            (to->L ? to->L : to->B)[i * wanted + j - n2] = J[j * n2 + i];
    }
    rolni_copy(n, s, z);
    rolni_copy(n, s + n, zd);
    return ROLN_OK;
}

/* scratch of NAME_linear */
typedef struct {
    ROLNI_(linear_base) base;
    roln_real J[(2 * ROLN_(n) + ROLN_(force_size)) * 2 * ROLN_(n)];
    roln_real work[ROLNI_ADVANCE_JAC_WORK(ROLN_(jac_tau))];
} ROLN_(linear_work);

/* NAME_step and its derivatives, for LQR, EKF and MPC: j->A = d(z,zd)+ / d(z,zd) [2n][2n], j->B = d(z,zd)+ / d tau
   [2n][force_size], or by the inputs. Of a driven joint tau is its acceleration. With ROLN_STICTION the coordinates that this step
   holds stay held: their rows zd+ of A and B are 0. s and j stay as they were unless ROLN_OK. Status
   of NAME_step; ROLN_E_NOT_FINITE also if A or B is not finite, ROLN_E_ILL_CONDITIONED of roln_lnn_step_jac. Cost, all derivatives
   of a stage at once: about two steps with n = 2, three with n = 4, four with n = 6. */
ROLN_FN roln_status ROLN_(linear)(const ROLN_(params) *p, ROLN_(latent) *s, const roln_real tau[ROLN_(force_size)], roln_real dt,
                                  ROLN_(jacobian) *j, ROLN_(linear_work) *w)
{
    rolni_push by;
    rolni_slopes to;
    by.tau = tau, by.load = NULL, by.dt = dt, by.how = ROLNI_TURN;
    to.A = j->A, to.B = j->B, to.L = NULL;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return ROLNI_(linear)(p, s->z, s->zd, &by, &to, &w->base, w->J, w->work);
}

/* Inverse dynamics tau_z = M zdd + C(z, zd) v + g + d [n] (roln_lnn_inverse); v [n], NULL: zd. zdd [n] in. tau_z is untouched
   unless ROLN_OK. Status of roln_lnn_inverse, ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(inverse)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_real v[ROLN_(n)],
                                   const roln_real zdd[ROLN_AT_LEAST(ROLN_(n))], roln_real tau_z[ROLN_AT_LEAST(ROLN_(n))],
                                   ROLN_(inverse_work) *w)
{
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if ((st = ROLNI_(inverse)(p, s, v, zdd, NULL, w)) == ROLN_OK) rolni_copy(ROLN_(n), w->a, tau_z);
    return st;
}

/* scratch of NAME_dynamics */
typedef struct {
    roln_real s[2 * ROLN_(n)], M[ROLN_(n) * ROLN_(n)], terms[3 * ROLN_(n) + 2]; /* c, g, d, T, V */
    roln_real tape[ROLN_LNN_TAPE(ROLN_, 1, 0, 1)];
    roln_real work[ROLN_LNN_DYNAMICS_WORK(ROLN_)];
} ROLN_(dynamics_work);

/* NAME_dynamics at z, zd; each pointer of out but M may be NULL. */
ROLN_FN roln_status ROLNI_(dynamics)(const ROLN_(params) *p, const roln_real *z, const roln_real *zd, const roln_dynamics_out *out,
                                     ROLN_(dynamics_work) *w)
{
    const int n = ROLN_(n);
    const roln_real unit = p->scale.m, f = unit / (p->scale.t * p->scale.t);
    roln_real *const M = w->M, *const c = w->terms, *const g = c + n, *const d = g + n, *const T = d + n, *const V = T + 1;
    const roln_dynamics_out mine = {M, out->c ? c : NULL, out->g ? g : NULL, d, T, V};
    roln_status st;
    int i;
    ROLNI_(net_state)(p, z, zd, w->s);
    rolni_zero(2 * n, c); /* c, g: not asked for */
    if ((st = roln_lnn_dynamics(&ROLN_(model).lnn, ROLNI_(net)(p), w->s, &mine, w->tape, w->work)) != ROLN_OK) return st;
    for (i = 0; i < 3 * n + 2; i++)
        c[i] *= f;
    for (i = 0; i < n * n; i++)
        M[i] *= unit;
    if (!roln_all_finite(3 * n + 2, c) || !roln_all_finite(n * n, M)) return ROLN_E_NOT_FINITE;
    rolni_copy(n * n, M, out->M);
    if (out->c) rolni_copy(n, c, out->c);
    if (out->g) rolni_copy(n, g, out->g);
    if (out->d) rolni_copy(n, d, out->d);
    if (out->T) *out->T = *T;
    if (out->V) *out->V = *V;
    return ROLN_OK;
}

/* The terms of M zdd + c + g + d = tau_z at s: M [n][n], c = C zd, g, d = R zd and friction [n], kinetic and potential energy T, V.
   d has the smooth law of dry friction, with ROLN_STICTION, too. With E = T + V the power balance is dE/dt = zd^T (tau_z - d). If
   no force did work in training, all of them, and forces with them, share one unknown factor. e is untouched unless ROLN_OK. Status
   of roln_lnn_dynamics; ROLN_E_NOT_FINITE also if a term is not finite in these units. */
ROLN_FN roln_status ROLN_(dynamics)(const ROLN_(params) *p, const ROLN_(latent) *s, ROLN_(equation) *e, ROLN_(dynamics_work) *w)
{
    roln_dynamics_out out;
    out.M = e->M, out.c = e->c, out.g = e->g, out.d = e->d, out.T = &e->T, out.V = &e->V;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return ROLNI_(dynamics)(p, s->z, s->zd, &out, w);
}

#if ROLN_FRICTION > 0
/* The dry friction c_j tanh(zd_j / v_j) that was learned: c [n], in J, and v [n], in 1/s; with ROLN_FRICTION 2 NAME_friction_law
   returns the rest of the law. Of a joint without autoencoder c / p->scale.q, in Nm, and v p->scale.q, in rad/s; with ROLN_SCALE
   each p->scale.q p->each[j] in place of p->scale.q. c, v are untouched unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(friction_of)(const ROLN_(params) *p, roln_real c[ROLN_AT_LEAST(ROLN_(n))],
                                       roln_real v[ROLN_AT_LEAST(ROLN_(n))])
{
    const roln_real *logs = ROLNI_(net)(p) + rolni_friction_at(&ROLN_(model).lnn), t = p->scale.t;
    roln_real out[2 * ROLN_(n)];
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    for (i = 0; i < ROLN_(n); i++) {
        out[i] = roln_exp(logs[i]) / (t * t) * p->scale.m;
        out[ROLN_(n) + i] = roln_exp(logs[ROLN_(n) + i]) / t;
    }
    if (!roln_all_finite(2 * ROLN_(n), out)) return ROLN_E_NOT_FINITE;
    rolni_copy(ROLN_(n), out, c);
    rolni_copy(ROLN_(n), out + ROLN_(n), v);
    return ROLN_OK;
}
#if ROLN_FRICTION > 1
/* The law of friction that was learned, law [n]. c, s are in J and v, w in 1/s; those of a joint follow as c, v of
   NAME_friction_of. l, a have no unit. law is untouched unless ROLN_OK. ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(friction_law)(const ROLN_(params) *p, roln_friction law[ROLN_AT_LEAST(ROLN_(n))])
{
    const roln_real *at = ROLNI_(net)(p) + rolni_friction_at(&ROLN_(model).lnn), t = p->scale.t, force = p->scale.m / (t * t);
    roln_friction out[ROLN_(n)];
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    for (i = 0; i < ROLN_(n); i++, at++) {
        roln_friction *const o = out + i;
        o->c = roln_exp(at[0]) * force, o->v = roln_exp(at[ROLN_(n)]) / t;
        o->s = roln_exp(at[2 * ROLN_(n)]) * force, o->w = roln_exp(at[3 * ROLN_(n)]) / t;
        o->l = roln_exp(at[4 * ROLN_(n)]), o->a = roln_tanh(at[5 * ROLN_(n)]);
        if (!roln_finite(o->c) || !roln_finite(o->v) || !roln_finite(o->s) || !roln_finite(o->w) || !roln_finite(o->l) ||
            !roln_finite(o->a))
            return ROLN_E_NOT_FINITE;
    }
    for (i = 0; i < ROLN_(n); i++)
        law[i] = out[i];
    return ROLN_OK;
}
#endif
#else
ROLNI_ASSERT(friction_must_be_a_number_that_the_preprocessor_can_read, (ROLN_FRICTION) == 0)
#endif
#if !(ROLN_STICTION > 0)
ROLNI_ASSERT(stiction_must_be_a_number_that_the_preprocessor_can_read, (ROLN_STICTION) == 0)
#endif

#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
/* The actuators that were learned, in user's units: gain k, damping d and offset o [N] each, of the torque tau = k u + o of
   currents, or tau = k (u - q) - d qd + o of servos. damping is 0 of currents. Any of the three may be NULL. They are untouched
   unless ROLN_OK. Motion alone tells M, V, k, d and o but for one common factor, which is that of k = 1 at the start: ratios of
   gains, k_i / k_j, and o_j / k_j, d_j / k_j are the machine's. ROLN_E_SHAPE, ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(actuator_of)(const ROLN_(params) *p, roln_real *gain, roln_real *damping, roln_real *offset)
{
    int j;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    for (j = 0; j < ROLN_(N); j++) {
        const rolni_actuator f = ROLNI_(actuator)(p, j);
        if (!roln_finite(f.k) || !roln_finite(f.d) || !roln_finite(f.o)) return ROLN_E_NOT_FINITE;
    }
    for (j = 0; j < ROLN_(N); j++) {
        const rolni_actuator f = ROLNI_(actuator)(p, j);
        if (gain) gain[j] = f.k;
        if (damping) damping[j] = f.d;
        if (offset) offset[j] = f.o;
    }
    return ROLN_OK;
}
#endif

/* scratch of NAME_inertia: s = [z; 0], then [z; D v]; p = M D v */
typedef struct {
    roln_real s[2 * ROLN_(n)], p[ROLN_(n)], net[ROLN_LNN_TAPE(ROLN_, 1, 0, 1)];
    roln_real tape[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)]; /* its end: q, v in units of the networks */
    union {
        roln_real eval[ROLNI_EVAL_WORK(ROLN_, 1, 0, ROLNI_MASS, 1)], decode[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1, 1))];
        roln_real mul[ROLN_(n)], lift[ROLNI_ROOM(ROLN_AE_LIFT_WORK(ROLN_, 1))];
    } u;
} ROLN_(inertia_work);

/* y = D^T M D v with D = D(phi(z)): the inertia that the joints feel, as an operator, symmetric, positive semi-definite of rank n,
   and 1/2 qd^T y(qd) = T on the manifold. v [N] in, y [N] out (may be v), untouched unless ROLN_OK. Status of roln_lnn_dynamics,
   ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLN_(inertia)(const ROLN_(params) *p, const ROLN_(latent) *s, const roln_real v[ROLN_AT_LEAST(ROLN_(N))],
                                   roln_real y[ROLN_AT_LEAST(ROLN_(N))], ROLN_(inertia_work) *w)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int N = ROLN_(N), n = ROLN_(n);
    const rolni_tape t = rolni_tape_of(lnn, 1, 0, 1, w->net);
    roln_real *const x = w->tape + ROLN_AE_ENCODE_REST(ROLN_, 2, 1);
    roln_status st;
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    rolni_copy(n, s->z, w->s);
    rolni_zero(n, w->s + n);
    if ((st = rolni_eval(lnn, 0, 1, ROLNI_(net)(p), w->s, NULL, ROLNI_MASS, w->net, w->u.eval)) != ROLN_OK) return st;
    roln_ae_decode(ae, 1, 1, p->theta, s->z, x, w->u.decode);
    for (i = 0; i < N; i++)
        x[N + i] = v[i] / p->scale.q;
    rolni_divide_each(1, N, ROLNI_EACH(p), x + N);
    roln_ae_encode(ae, 2, 1, p->theta, x, w->s, w->tape);
    rolni_mul(lnn, &t, 0, w->s + n, w->p, w->u.mul);
    roln_ae_lift_tape(ae, 2, 1, w->tape, w->tape);
    roln_ae_lift(ae, 1, p->theta, w->tape, w->p, x, w->u.lift);
    for (i = 0; i < N; i++)
        x[i] = x[i] / p->scale.q * p->scale.m;
    rolni_divide_each(1, N, ROLNI_EACH(p), x);
    if (!roln_all_finite(N, x)) return ROLN_E_NOT_FINITE;
    rolni_copy(N, x, y);
    return ROLN_OK;
}

/* ---- 12 feedback and estimates --------------------------------------------------------------- */

/* The numbers of latent states s: [z; zd] [2n] each. */
ROLN_FN const roln_real *ROLNI_(numbers)(const ROLN_(latent) *s)
{
    return ROLNI_AS(const roln_real *, ROLNI_AS(const void *, s));
}

/* Scratch of a pose: e is a zd of 1 in one coordinate, x = [q; J e]. */
typedef struct {
    roln_real e[ROLN_(n)], x[2 * ROLN_(N)], s[2 * ROLN_(n)], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
} ROLNI_(pose_work);

/* q = phi(z) [N], and J [N][n], whose column j is qd of unit zd. */
ROLN_FN roln_status ROLNI_(pose)(const ROLN_(params) *p, const roln_real *z, roln_real *q, roln_real *J, ROLNI_(pose_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    int i, j;
    for (j = 0; j < n; j++) {
        roln_status st;
        for (i = 0; i < n; i++)
            w->e[i] = i == j;
        if ((st = ROLNI_(decode)(p, z, w->e, w->x, w->tape, w->s)) != ROLN_OK) return st;
        rolni_copy(N, w->x, q);
        for (i = 0; i < N; i++)
            J[i * n + j] = w->x[N + i];
    }
    return ROLN_OK;
}

/* Scratch of a linearisation by motors: the force tau that they make, and the derivatives F by it. */
typedef struct {
    roln_real tau[ROLN_(N)], F[2 * ROLN_(n) * ROLN_(force_size)];
    ROLN_(linear_work) linear;
} ROLNI_(linear_motors_work);

/* NAME_linear under motors; s [2n] in and out, A [2n][2n], B [2n][count] out. */
ROLN_FN roln_status ROLNI_(linear_motors)(const ROLN_(params) *p, const rolni_acting *by, roln_real *s, roln_real *A, roln_real *B,
                                          ROLNI_(linear_motors_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    const roln_motors *f = by->motors;
    rolni_push push;
    rolni_slopes to;
    roln_status st;
    push.tau = rolni_motors_tau(N, f, by->u, w->tau), push.load = by->load, push.dt = by->dt, push.how = ROLNI_SLIDE;
    to.A = A, to.B = w->F, to.L = NULL;
    st = ROLNI_(linear)(p, s, s + n, &push, &to, &w->linear.base, w->linear.J, w->linear.work);
    if (st != ROLN_OK) return st;
    if (f && ROLN_(inputs) == 0) roln_mm(2 * n, N, f->count, w->F, f->B, B);
    else rolni_copy(2 * n * ROLN_(force_size), w->F, B);
    return ROLN_OK;
}

/* Scratch of the cost of joints: q, J [N][n], and J weighted for q and for qd, W [2][N][n]. */
typedef struct {
    roln_real q[ROLN_(N)], J[ROLN_(N) * ROLN_(n)], W[2 * ROLN_(N) * ROLN_(n)];
    union {
        ROLNI_(pose_work) pose;
        roln_real triangle[ROLN_QR_R_WORK(ROLN_(N), ROLN_(n))];
    } u;
} ROLNI_(cost_joints_work);

/* D [2n][2n], in which |D (dz, dzd)|^2 is the cost of the joints at z. */
ROLN_FN roln_status ROLNI_(cost_joints)(const ROLN_(params) *p, const roln_cost *cost, const roln_real *z, roln_real *D,
                                        ROLNI_(cost_joints_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_real *const W = w->W;
    roln_status st;
    int i, k;
    for (i = 0; i < N; i++)
        if (cost->q[i] < 0 || cost->qd[i] < 0) return ROLN_E_NOT_SPD;
    if ((st = ROLNI_(pose)(p, z, w->q, w->J, &w->u.pose)) != ROLN_OK) return st;
    for (i = 0; i < N * n; i++) {
        W[i] = ROLN_SQRT(cost->q[i / n]) * w->J[i];
        W[N * n + i] = ROLN_SQRT(cost->qd[i / n]) * w->J[i];
    }
    rolni_zero(4 * n * n, D);
    for (k = 0; k < 2; k++) {
        roln_qr_r(N, n, W + k * N * n, w->u.triangle);
        for (i = 0; i < n; i++)
            rolni_copy(n, W + (k * N + i) * n, D + (k * n + i) * 2 * n + k * n);
    }
    return roln_all_finite(4 * n * n, D) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Scratch of a step from the state `at` and of its cost. */
typedef struct {
    roln_real at[2 * ROLN_(n)];
    union {
        ROLNI_(linear_motors_work) linear;
        ROLNI_(cost_joints_work) joints;
    } u;
} ROLNI_(cost_work);

/* Dry friction has no slope but about rest, where tanh is steep, and there it would look like ever so much damping: the velocities
   of s [2n] = [z; zd] become 4 v farther from 0. */
ROLN_FN void ROLNI_(beyond_friction)(const ROLN_(params) *p, roln_real *s)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int n = ROLN_(n);
    const roln_real *logs = ROLNI_(net)(p) + rolni_friction_at(lnn) + n; /* log v */
    int i;
    for (i = 0; i < (lnn->friction ? n : 0); i++)
        s[n + i] += (s[n + i] < 0 ? -4 : 4) * roln_exp(logs[i]) / p->scale.t;
}

/* The step at s [2n] = [z; zd] under the motors' u [count], NULL: none, as A [2n][2n], B [2n][count], and D of the cost. A is that
   beyond dry friction. */
ROLN_FN roln_status ROLNI_(cost_at)(const ROLN_(params) *p, const roln_cost *cost, const roln_real *s, const roln_real *u,
                                    roln_real *A, roln_real *B, roln_real *D, ROLNI_(cost_work) *w)
{
    const int n = ROLN_(n);
    rolni_acting by;
    roln_status st;
    if (!rolni_motors_valid(&ROLN_(model), cost->motors)) return ROLN_E_LENGTH;
    if (!(cost->dt > 0)) return ROLN_E_RANGE;
    by.motors = cost->motors, by.u = u, by.load = NULL, by.dt = cost->dt;
    rolni_copy(2 * n, s, w->at);
    ROLNI_(beyond_friction)(p, w->at);
    st = ROLNI_(linear_motors)(p, &by, w->at, A, B, &w->u.linear);
    return st == ROLN_OK ? ROLNI_(cost_joints)(p, cost, s, D, &w->u.joints) : st;
}

/* scratch of NAME_lqr: the step, roots of the cost of the joints and of the cost to go */
typedef struct {
    roln_real A[4 * ROLN_(n) * ROLN_(n)], B[2 * ROLN_(n) * ROLN_(force_size)];
    roln_real D[4 * ROLN_(n) * ROLN_(n)], C[4 * ROLN_(n) * ROLN_(n)];
    union {
        ROLNI_(cost_work) cost;
        roln_real dare[ROLN_DARE_WORK(2 * ROLN_(n), ROLN_(force_size))];
    } u;
} ROLN_(lqr_work);

/* Feedback of least cost about a state that u keeps, for ever (linear-quadratic regulator):
       u_k = u - K (s_k - s),   K [count][2n],   and the cost that then is left, ds^T P ds, P [2n][2n] (NULL: not wanted).
   s = [z; zd], a pose has zd = 0; u [count] the motors' torques there, held over a step, NULL: none. K, P are untouched unless
   ROLN_OK. ROLN_E_NO_CONVERGENCE: the motors cannot stabilise it, or no joint that weighs sees what has to be stabilised;
   ROLN_E_NOT_SPD: a weight of the motors is not above 0, or one of the joints is below; ROLN_E_LENGTH: motors;
   ROLN_E_RANGE: dt; ROLN_E_NOT_FINITE: P; status of NAME_linear, roln_dare. Dry friction is left out, it is no damping; with
   ROLN_STICTION A and B are those of a step without it. Cost: NAME_linear and roln_dare of 2n. */
ROLN_FN roln_status ROLN_(lqr)(const ROLN_(params) *p, const roln_cost *cost, const ROLN_(latent) *s, const roln_real *u,
                               roln_real *K, roln_real *P, ROLN_(lqr_work) *w)
{
    const int n2 = 2 * ROLN_(n), motors = rolni_torques(&ROLN_(model), cost->motors);
    roln_status st;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    st = ROLNI_(cost_at)(p, cost, ROLNI_(numbers)(s), u, w->A, w->B, w->D, &w->u.cost);
    if (st == ROLN_OK) st = roln_dare(n2, motors, w->A, w->B, w->D, cost->u, w->C, w->B, w->u.dare);
    if (st != ROLN_OK) return st;
    if (P) {
        rolni_zero(n2 * n2, w->A);
        roln_mm_at(n2, n2, n2, w->C, w->C, w->A);
        if (!roln_all_finite(n2 * n2, w->A)) return ROLN_E_NOT_FINITE;
        rolni_copy(n2 * n2, w->A, P);
    }
    rolni_copy(motors * n2, w->B, K);
    return ROLN_OK;
}

/* scratch of NAME_lqr_along, as NAME_lqr_work */
typedef struct {
    roln_real A[4 * ROLN_(n) * ROLN_(n)], B[2 * ROLN_(n) * ROLN_(force_size)];
    roln_real D[4 * ROLN_(n) * ROLN_(n)], C[4 * ROLN_(n) * ROLN_(n)];
    union {
        ROLNI_(cost_work) cost;
        roln_real riccati[ROLN_RICCATI_WORK(2 * ROLN_(n), ROLN_(force_size))];
        struct {
            roln_real l[2 * ROLN_(n)], eig[ROLN_EIG_WORK(2 * ROLN_(n))];
        } end;
    } u;
} ROLN_(lqr_along_work);

/* The same along a reference s [count + 1] that u [count][motors] (NULL: none) drives, step k from s_k to s_k+1, up to its end,
   where ds^T P ds remains to be paid: P [2n][2n], positive semi-definite, of NAME_lqr there, say; NULL: the weights of the joints.
       u'_k = u_k - K_k (s'_k - s_k),   K [count][motors][2n]
   By steps of roln_riccati from the last to the first. ROLN_E_LENGTH: count below 1, motors; else as NAME_lqr, ROLN_E_NOT_SPD
   also of P; then those K are written that were computed before it failed, the last ones. */
ROLN_FN roln_status ROLN_(lqr_along)(const ROLN_(params) *p, const roln_cost *cost, int count, const ROLN_(latent) *s,
                                     const roln_real *u, const roln_real *P, roln_real *K, ROLN_(lqr_along_work) *w)
{
    const int n2 = 2 * ROLN_(n), motors = rolni_torques(&ROLN_(model), cost->motors);
    roln_status st;
    int k;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (count < 1 || !rolni_motors_valid(&ROLN_(model), cost->motors)) return ROLN_E_LENGTH;
    st = P ? rolni_lqr_end(n2, P, w->C, w->u.end.l, w->u.end.eig)
           : ROLNI_(cost_joints)(p, cost, s[count].z, w->C, &w->u.cost.u.joints);
    for (k = count - 1; k >= 0 && st == ROLN_OK; k--) {
        st = ROLNI_(cost_at)(p, cost, ROLNI_(numbers)(s + k), u ? u + k * motors : NULL, w->A, w->B, w->D, &w->u.cost);
        if (st == ROLN_OK) st = roln_riccati(n2, motors, w->A, w->B, w->D, cost->u, w->C, K + k * motors * n2, w->u.riccati);
    }
    return st;
}

/* Scratch of unknown torques: the mass matrix M, then its Cholesky factor; T [N][n], T^T T = J^T diag(tau^2) J. */
typedef struct {
    roln_real M[ROLN_(n) * ROLN_(n)], T[ROLN_(N) * ROLN_(n)];
    union {
        ROLN_(dynamics_work) dynamics;
        roln_real triangle[ROLN_QR_R_WORK(ROLN_(N), ROLN_(n))];
    } u;
} ROLNI_(unknown_work);

/* scratch of NAME_filter_tick: state s [side], side = 2n or, with a load, 3n, and factor F; the pose q that the state decodes to, J
   there; room for products A [side][side] and for rows of triangles, those of a measurement or, with a load, of two noises */
typedef struct {
    roln_real s[ROLN_(filtered)], F[ROLN_(filtered) * ROLN_(filtered)], A[ROLN_(filtered) * ROLN_(filtered)];
    roln_real q[ROLN_(N)], J[ROLN_(N) * ROLN_(n)];
    roln_real rows[ROLN_MAX((ROLN_(filtered) + ROLN_(N)) * (ROLN_(filtered) + 1), ROLN_(load) * 15 * ROLN_(n) * ROLN_(n))];
    union {
        struct {
            ROLNI_(linear_base) base;
            roln_real J[(2 * ROLN_(n) + ROLN_(looks)) * 2 * ROLN_(n)];
            roln_real work[ROLNI_ADVANCE_JAC_WORK(ROLN_(jac_load))];
        } linear;
        ROLNI_(pose_work) pose;
        ROLNI_(unknown_work) unknown;
        struct {
            roln_real T[ROLN_(N) * ROLN_(n)], triangle[ROLN_QR_R_WORK(ROLN_(N), ROLN_(n))];
        } wander;
        roln_real encode[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)];
        roln_real predict[ROLN_QR_R_WORK((3 + 2 * ROLN_(load)) * ROLN_(n), ROLN_(filtered))];
        roln_real correct[ROLN_QR_R_WORK(ROLN_(filtered) + ROLN_(N), ROLN_(filtered) + 1)];
        struct {
            roln_real w[ROLN_(filtered)], d[ROLN_(filtered)];
        } step;
    } u;
} ROLN_(filter_tick_work);

/* A factor of what torques of deviation d do to z, T^T T = by^2 J^T diag(d^2) J, a triangle in T [N][n]: d is dev [N]; NULL: one,
   in units of the joints. work [ROLN_QR_R_WORK(N, n)]. */
ROLN_FN void ROLNI_(filter_torques)(const ROLN_(params) *p, const roln_real *J, const roln_real *dev, roln_real one, roln_real by,
                                    roln_real *T, roln_real *work)
{
    const int N = ROLN_(N), n = ROLN_(n);
    const roln_real *each = ROLNI_EACH(p);
    int i;
    (void)p;
    for (i = 0; i < N * n; i++)
        T[i] = by * (dev ? dev[i / n] : each ? one / each[i / n] : one) * J[i];
    roln_qr_r(N, n, T, work);
}

/* The last rows of a factor, W [n][3n]: what the load has wandered in some seconds, W^T W = seconds J^T diag(noise->load^2) J. */
ROLN_FN void ROLNI_(filter_wander)(const ROLN_(params) *p, const roln_noise *noise, roln_real seconds, roln_real *W,
                                   ROLN_(filter_tick_work) *w)
{
    const int n = ROLN_(n), side = 3 * n;
    roln_real *const T = w->u.wander.T;
    int i;
    ROLNI_(filter_torques)(p, w->J, NULL, noise->load, ROLN_SQRT(seconds), T, w->u.wander.triangle);
    rolni_zero(n * side, W);
    for (i = 0; i < n; i++)
        rolni_copy(n, T + i * n, W + i * side + 2 * n);
}

/* Factor W [n][side] of what unknown torques do to the state in a tick, W^T W: with T^T T = J^T diag(tau^2) J, a triangle,
       W = [dt^2/2 G  dt G  0],   G = T M^-1
   Outside of the range seen in training the model guesses: ten times as much, a guess, too. load: 1 or 0. */
ROLN_FN roln_status ROLNI_(filter_unknown)(const ROLN_(params) *p, const roln_noise *noise, int load, roln_real *W,
                                           ROLN_(filter_tick_work) *w)
{
    const int n = ROLN_(n), side = (2 + load) * n;
    const roln_real by = ROLNI_(in_range)(p, 0, w->s, w->s + n) ? noise->dt : 10 * noise->dt;
    roln_real *const M = w->u.unknown.M, *const T = w->u.unknown.T;
    const roln_dynamics_out out = {M, NULL, NULL, NULL, NULL, NULL};
    roln_status st = ROLNI_(dynamics)(p, w->s, w->s + n, &out, &w->u.unknown.u.dynamics);
    int i, j;
    if (st == ROLN_OK) st = roln_chol(n, M, M);
    if (st != ROLN_OK) return st;
    ROLNI_(filter_torques)(p, w->J, noise->tau_each, noise->tau, by, T, w->u.unknown.u.triangle);
    for (j = 0; j < n; j++) {
        roln_real *const row = W + j * side;
        if (load) rolni_zero(n, row + 2 * n);
        roln_solve_lower(n, M, T + j * n, row + n);
        roln_solve_lower_t(n, M, row + n, row + n);
        for (i = 0; i < n; i++)
            row[i] = noise->dt / 2 * row[n + i];
    }
    return ROLN_OK;
}

/* The same from the derivatives of the step by a load, L [2n][n], which are M^-1 dt^2/2 and M^-1 dt of leapfrog: W = [T L^T  0]. */
ROLN_FN void ROLNI_(filter_leapt)(const ROLN_(params) *p, const roln_noise *noise, int load, const roln_real *L, roln_real *W,
                                  ROLN_(filter_tick_work) *w)
{
    const int n = ROLN_(n), side = (2 + load) * n;
    roln_real *const T = w->u.wander.T;
    int j;
    ROLNI_(filter_torques)(p, w->J, noise->tau_each, noise->tau, ROLNI_(in_range)(p, 0, w->s, w->s + n) ? 1 : 10, T,
                           w->u.wander.triangle);
    for (j = 0; j < n; j++) {
        roln_mm_bt(1, n, 2 * n, T + j * n, L, W + j * side);
        rolni_zero(load * n, W + j * side + 2 * n);
    }
}

/* A step of leapfrog for the filter and the observer. It evaluates forces at the middle of the tick, with the acceleration zdd [n]
   of the last tick, 0 at a start:
       zd+ = zd + dt f(z + dt/2 zd, zd + dt/2 zdd),   z+ = z + dt/2 (zd + zd+),   zdd+ = (zd+ - zd) / dt
   So its order is 2 also if f depends on zd. `leap_begin` moves s [2n] so that a plain step of leapfrog from there computes zd+,
   with its derivatives, and keeps zd [n] of s. `leap_end`, after that step, writes s = (z+, zd+) and zdd+. zdd NULL: both do
   nothing; the integrator is another one. */
ROLN_FN void ROLNI_(leap_begin)(roln_real dt, const roln_real *zdd, roln_real *s, roln_real *zd)
{
    const int n = ROLN_(n);
    int i;
    for (i = 0; i < n && zdd; i++) {
        zd[i] = s[n + i];
        s[i] -= dt * dt / 4 * zdd[i];
        s[n + i] += dt / 2 * zdd[i];
    }
}
ROLN_FN void ROLNI_(leap_end)(roln_real dt, const roln_real *zd, roln_real *zdd, roln_real *s)
{
    const int n = ROLN_(n);
    int i;
    for (i = 0; i < n && zdd; i++) {
        s[i] -= dt * dt / 4 * zdd[i];
        s[n + i] -= dt / 2 * zdd[i];
        zdd[i] = (s[n + i] - zd[i]) / dt;
    }
}

/* A tick on: the model's step under tau, NULL: none, and the load, and the triangle of [F A^T; W], with a load of [F [A L; 0 I]^T;
   W; what it wanders]. Then q, J there. zdd: of NAME_i_leap_begin. */
ROLN_FN roln_status ROLNI_(filter_predict)(const ROLN_(params) *p, const roln_noise *noise, const roln_real *tau, int load,
                                           roln_real *zdd, ROLN_(filter_tick_work) *w)
{
    const int n = ROLN_(n), n2 = 2 * n, side = (2 + load) * n;
    rolni_push by;
    rolni_slopes to;
    const int leaps = ROLN_(leaps);
    roln_real zd[ROLN_(n)];
    roln_status st;
    int i, k;
    if (leaps) rolni_zero(n, w->q); /* no load */
    by.tau = tau, by.load = load ? w->s + n2 : leaps ? w->q : NULL, by.dt = noise->dt, by.how = ROLNI_LOOK;
    to.A = load ? w->rows : w->A, to.B = NULL, to.L = load ? w->rows + n2 * n2 : leaps ? w->rows : NULL;
    ROLNI_(leap_begin)(noise->dt, zdd, w->s, zd);
    st = ROLNI_(linear)(p, w->s, w->s + n, &by, &to, &w->u.linear.base, w->u.linear.J, w->u.linear.work);
    ROLNI_(leap_end)(noise->dt, zd, zdd, w->s);
    for (i = 0; i < n && st == ROLN_OK; i++)
        if (roln_lnn_angle(&ROLN_(model).lnn, i)) w->s[i] = roln_wrap(w->s[i]);
    for (i = 0; i < side && load && st == ROLN_OK; i++)
        for (k = 0; k < side; k++)
            w->A[i * side + k] = i >= n2 ? i == k : k < n2 ? to.A[i * n2 + k] : to.L[i * n + k - n2];
    if (st == ROLN_OK) st = ROLNI_(pose)(p, w->s, w->q, w->J, &w->u.pose);
    if (st == ROLN_OK && !leaps) st = ROLNI_(filter_unknown)(p, noise, load, w->rows + side * side, w);
    if (st != ROLN_OK) return st;
    if (leaps) ROLNI_(filter_leapt)(p, noise, load, to.L, w->rows + side * side, w);
    if (load) ROLNI_(filter_wander)(p, noise, noise->dt, w->rows + (side + n) * side, w);
    roln_mm_bt(side, side, side, w->F, w->A, w->rows);
    roln_qr_r(load ? side + n2 : side + n, side, w->rows, w->u.predict);
    rolni_copy(side * side, w->rows, w->F);
    return roln_all_finite(side * side, w->F) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Rows of the measured joints, each in its own deviation: [J_i F_z^T  e_i], F_z the columns of z, e_i = y_i - q_i; one beyond the
   gate, e_i^2 > gate^2 (|J_i F_z^T|^2 + 1), stays 0, and if there are more of them than others, all do. */
ROLN_FN rolni_innovation ROLNI_(filter_rows)(const roln_noise *noise, roln_real gate, const roln_real *y, int load,
                                             ROLN_(filter_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), ns = (2 + load) * n, side = ns + 1;
    roln_real *const rows = w->rows + ns * side;
    rolni_innovation in = {0, 0, 0};
    int i, k;
    rolni_zero((ns + N) * side, w->rows);
    for (i = 0; i < ns; i++)
        w->rows[i * side + i] = 1;
    for (i = 0; i < N; i++) {
        const roln_real r = noise->q_each ? noise->q_each[i] : noise->q;
        roln_real *const row = rows + i * side, e;
        if (!roln_finite(y[i])) continue;
        for (k = 0; k < ns; k++)
            row[k] = roln_dot(n, w->J + i * n, w->F + k * ns) / r;
        e = row[ns] = (y[i] - roln_lnn_near(&ROLN_(model).lnn, i, y[i], w->q[i])) / r;
        in.measured++;
        if (gate > 0 && !(ROLN_ABS(e) <= gate * ROLN_SQRT(roln_dot(ns, row, row) + 1))) rolni_zero(side, row);
        else in.used++;
    }
    if (2 * in.used < in.measured) in.used = 0;
    if (in.used == 0) rolni_zero(N * side, rows);
    return in;
}

/* The state that is likeliest after a measurement y [N], NaN: not measured. With an error F^T w, w of covariance I, it is that of
   least |w|^2 + sum ((J dz)_i - e_i)^2 / r_i^2: one triangle,
       [I 0; J F_z^T / r  e / r] = U [R b; 0 rho],   R w = b,   dx = F^T w,   F+ = R^-T F,   nis = rho^2
   R^T R is I and more: nothing is subtracted, F^T F never loses its sign. R is left in A. */
ROLN_FN roln_status ROLNI_(filter_correct)(const roln_noise *noise, roln_real gate, const roln_real *y, int load,
                                           rolni_innovation *in, ROLN_(filter_tick_work) *at)
{
    const int N = ROLN_(N), n = ROLN_(n), ns = (2 + load) * n, side = ns + 1;
    roln_real *const w = at->u.step.w, *const d = at->u.step.d, *const A = at->A, *const b = at->rows + ns;
    int i, k;
    *in = ROLNI_(filter_rows)(noise, gate, y, load, at);
    if (in->used == 0) return ROLN_OK;
    roln_qr_r(ns + N, side, at->rows, at->u.correct);
    for (i = 0; i < ns; i++)
        rolni_copy(ns, at->rows + i * side, A + i * ns);
    in->nis = at->rows[ns * side + ns] * at->rows[ns * side + ns];
    for (i = ns - 1; i >= 0; i--) {
        w[i] = b[i * side];
        for (k = i + 1; k < ns; k++)
            w[i] -= A[i * ns + k] * w[k];
        w[i] /= A[i * (ns + 1)];
    }
    roln_mm(1, ns, ns, w, at->F, d);
    for (i = 0; i < ns; i++)
        at->s[i] += d[i];
    for (i = 0; i < n; i++)
        if (roln_lnn_angle(&ROLN_(model).lnn, i)) at->s[i] = roln_wrap(at->s[i]);
    rolni_solve_upper_t(ns, ns, A, at->F);
    return roln_all_finite(ns, at->s) && roln_all_finite(ns * ns, at->F) && roln_finite(in->nis) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* At the pose y, at rest, in the middle of all velocities that training has seen. The load is 0, and its deviation is what it
   wanders in a second: a settled filter knows the load better, so a start takes no longer than following a change. Joints that were
   not measured are those of z [n]; NULL: none may be missing. Returns ROLN_FILTER_START, or bits that say why not. */
ROLN_FN uint32_t ROLNI_(filter_start)(const ROLN_(params) *p, const roln_noise *noise, const roln_real *y, const roln_real *z,
                                      int load, rolni_innovation *in, roln_real *zdd, ROLN_(filter_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), side = (2 + load) * n;
    int i;
    if (zdd) rolni_zero(n, zdd);
    if (!z && !roln_all_finite(N, y)) return ROLN_FILTER_NONE;
    if (z && ROLNI_(pose)(p, z, w->q, w->J, &w->u.pose) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    for (i = 0; i < N; i++)
        w->q[i] = roln_finite(y[i]) ? y[i] : w->q[i];
    rolni_zero(N, w->J); /* qd */
    rolni_zero(side * side, w->F);
    for (i = 0; i < n; i++) {
        const roln_real wide = p->z_max[i] - p->z_min[i], fast = p->zd_max[i];
        if (!(wide > 0) || !(fast > 0)) return ROLN_FAULT_RANGE | ROLN_FILTER_NONE;
        w->F[i * (side + 1)] = wide;
        w->F[(n + i) * (side + 1)] = fast;
    }
    if (ROLNI_(encode)(p, w->q, w->J, NULL, w->s, w->u.encode) != ROLN_OK ||
        ROLNI_(pose)(p, w->s, w->q, w->J, &w->u.pose) != ROLN_OK)
        return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    if (load) rolni_zero(n, w->s + 2 * n), ROLNI_(filter_wander)(p, noise, 1, w->F + 2 * n * side, w);
    if (ROLNI_(filter_correct)(noise, 0, y, load, in, w) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    return ROLN_FILTER_START;
}

/* The measured joints correct the estimate at w, a tick on; `measured` of y [N] are numbers. Returns the faults. */
ROLN_FN uint32_t ROLNI_(filter_follow)(const ROLN_(params) *p, const roln_noise *noise, const roln_real *y, int measured,
                                       const roln_real *tau, rolni_innovation *in, ROLN_(filter) *f, ROLN_(filter_tick_work) *w)
{
    const int n = ROLN_(n), load = ROLN_(load);
    roln_status st;
    rolni_copy(n, f->s.z, w->s);
    rolni_copy(n, f->s.zd, w->s + n);
    if (load) rolni_copy(n, ROLNI_LOAD_OF(f), w->s + 2 * n);
    rolni_copy(ROLN_(filtered) * ROLN_(filtered), f->F, w->F);
    st = ROLNI_(filter_predict)(p, noise, tau, load, ROLNI_LAST_OF_FILTER(f), w);
    if (st == ROLN_OK && measured > 0) st = ROLNI_(filter_correct)(noise, noise->gate, y, load, in, w);
    if (st == ROLN_OK && !ROLNI_(in_range)(p, 10, w->s, w->s + n)) st = ROLN_E_RANGE;
    if (st == ROLN_OK) return 0;
    f->f.valid = 0;
    return ROLN_FAULT_STATUS;
}

/* One tick of a Kalman filter on the model, extended (linearised at the estimate) and in square roots: z, zd from positions alone.
       predict    the model's step under tau, NAME_linear; covariance P = A P A^T + Q, Q that of unknown torques, noise->tau;
                  with ROLN_FILTER leapfrog a step by one evaluation, of order 2, for dt |d zdd / d zd| < 1
       correct    by the joints that were measured, y = phi(z) + noise of deviation noise->q
   y [N] measured, NaN: that joint was not; NULL: none was. tau [force_size] the force that was held since the last tick, NULL:
   none. f->s and, with ROLN_LOAD, f->load are the estimate, F^T F the covariance of its error. With ROLN_LOAD the state is
   [z; zd; load], the load constant but for what it wanders, noise->load; it takes up what a model that is a little wrong leaves
   over, too; a start begins with none.
   A joint beyond noise->gate deviations of what is expected is not used, and counted; if more are than are not, none is used. A
   tick that leaves fewer than n joints because of that is lost; noise->lost of them in a row are bridged by the model, at the next
   one the filter starts again, ROLN_FILTER_START: at the pose that is measured, at rest, with zd as unknown as training has seen
   it, which a few ticks mend. It starts so with the first measurement of all joints.
   Angles of joints may be on any turn; z of an angle is within (-pi, pi].
   Returns bits, also added to f->f.faults: ROLN_FILTER_..; ROLN_FAULT_RANGE: the estimate is outside of the range that
   training has seen, where unknown torques count ten times, or, with ROLN_FILTER_NONE, the model holds no range (NAME_fit_range);
   ROLN_FAULT_STATUS: a function on the way failed, or led further out than ten times the width of that range; the estimate is the
   last one, unless this measurement starts it again, or else the next; or the parameters do not match, and nothing is done;
   ROLN_FAULT_INPUT: settings that make no sense, then nothing is done, and ROLN_FILTER_NONE stands beside it, for the last estimate
   grows old; or tau is not finite, then it is left out. The estimate is always finite. Cost: NAME_linear, NAME_dynamics, n
   NAME_decode, 8 n^2 (6 n + N) multiply-adds, with a load 18 n^2 (10 n + N). */
ROLN_FN uint32_t ROLN_(filter_tick)(const ROLN_(params) *p, const roln_noise *noise, const roln_real y[ROLN_(N)],
                                    const roln_real tau[ROLN_(force_size)], ROLN_(filter) *f, ROLN_(filter_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), load = ROLN_(load);
    roln_filter *const filter = &f->f;
    rolni_innovation in = {0, 0, 0};
    uint32_t faults = 0;
    int i, measured = 0;
    if (ROLN_(params_mismatch)(p)) {
        filter->faults |= ROLN_FAULT_STATUS;
        return ROLN_FAULT_STATUS;
    }
    if (!rolni_noise_valid(N, noise) || (load && (!roln_finite(noise->load) || !(noise->load >= 0)))) {
        filter->faults |= ROLN_FAULT_INPUT | ROLN_FILTER_NONE;
        return ROLN_FAULT_INPUT | ROLN_FILTER_NONE; /* the last estimate grows old */
    }
    if (tau && !roln_all_finite(ROLN_(force_size), tau)) faults |= ROLN_FAULT_INPUT, tau = NULL;
    for (i = 0; y && i < N; i++)
        measured += roln_finite(y[i]) != 0;
    if (measured < N) faults |= ROLN_FILTER_MISSING;
    if (filter->valid) faults |= ROLNI_(filter_follow)(p, noise, y, measured, tau, &in, f, w);
    faults |= rolni_filter_lost(filter, noise->lost, n, &in);
    if (!filter->valid) {
        in.used = 0;
        if (measured == 0) faults |= ROLN_FILTER_NONE;
        else faults |= ROLNI_(filter_start)(p, noise, y, filter->starts && measured < N ? f->s.z : NULL, load, &in,
                                            ROLNI_LAST_OF_FILTER(f), w);
        if (!rolni_filter_starts(filter, faults)) in.used = 0; /* nor is its nis a number */
    }
    if (filter->valid) {
        if (!ROLNI_(in_range)(p, 0, w->s, w->s + n)) faults |= ROLN_FAULT_RANGE;
        rolni_copy(n, w->s, f->s.z);
        rolni_copy(n, w->s + n, f->s.zd);
        if (load) rolni_copy(n, w->s + 2 * n, ROLNI_LOAD_OF(f));
        rolni_copy(ROLN_(filtered) * ROLN_(filtered), w->F, f->F);
    }
    filter->used = in.used, filter->nis = in.used > 0 ? in.nis : 0;
    filter->faults |= faults;
    return faults;
}

/* scratch of NAME_observer_tick: state s = [z; zd], joints x, innovations e in units of the decoder, b = J^T R^-1 e, the correction
   d; the step, then the decoder */
typedef struct {
    roln_real s[2 * ROLN_(n)], x[2 * ROLN_(N)], e[ROLN_(N)], b[ROLN_(n)], d[2 * ROLN_(n)];
    union {
        struct {
            ROLNI_(step_base) base;
            roln_real tape[ROLN_LNN_TAPE(ROLN_, 1, 0, 1)], work[ROLN_MAX(ROLN_(advance_1), ROLN_(leap_1))];
        } step;
        struct {
            roln_real s[2 * ROLN_(n)], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
            roln_real work[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, 1))];
        } decode;
        roln_real encode[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)];
    } u;
} ROLN_(observer_tick_work);

/* |z - at|^2 in widths of the range seen in training. */
ROLN_FN roln_real ROLNI_(distance)(const ROLN_(params) *p, const roln_real *z, const roln_real *at)
{
    roln_real sum = 0;
    int i;
    for (i = 0; i < ROLN_(n); i++) {
        const roln_real d = (roln_lnn_near(&ROLN_(model).lnn, i, at[i], z[i]) - at[i]) / (p->z_max[i] - p->z_min[i]);
        sum += d * d;
    }
    return sum;
}

/* The state s [2n] = [z; zd] moves by P(z) b, P a mean of all states, that at a distance of d widths with a weight of d^-4. After
   t ticks, beyond settle, the gains of a start have the part (settle / t)^2: those of z then fall as 1 / t, nearly. d [2n]:
   scratch. */
ROLN_FN void ROLNI_(observer_move)(const ROLN_(params) *p, const ROLN_(observer_gains) *g, roln_real age, const roln_real *b,
                                   roln_real *s, roln_real *d)
{
    const int n = ROLN_(n), n2 = 2 * n;
    const roln_real late = age > g->settle ? g->settle / age : 1, begin = late * late;
    roln_real sum = 0;
    int c, i, k;
    rolni_zero(n2, d);
    for (c = 0; c < ROLN_(centres); c++) {
        const roln_real off = ROLNI_(distance)(p, s, g->z[c]) + ROLN_C(0.0001), weight = 1 / (off * off);
        const roln_real *const P = g->P[0][c], *const first = g->P[1][c];
        sum += weight;
        for (i = 0; i < n2; i++)
            for (k = 0; k < n; k++)
                d[i] += weight * (P[i * n + k] + begin * (first[i * n + k] - P[i * n + k])) * b[k];
    }
    for (i = 0; i < n2; i++)
        s[i] += d[i] / sum;
}

/* The measured joints y correct the state at w: dx = K J^T R^-1 (y - phi(z)). A joint beyond the gate is left out. */
ROLN_FN roln_status ROLNI_(observer_correct)(const ROLN_(params) *p, const ROLN_(observer_gains) *g, roln_real age,
                                             const roln_real *y, rolni_innovation *in, ROLN_(observer_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    const roln_real *each = ROLNI_EACH(p);
    int i;
    (void)each;
    roln_ae_decode(&ROLN_(model).ae, 1, 1, p->theta, w->s, w->x, w->u.decode.tape);
    for (i = 0; i < N; i++) {
        const roln_real unit = p->scale.q * (each ? each[i] : 1);
        const roln_real q = unit * w->x[i], e = y[i] - roln_lnn_near(&ROLN_(model).lnn, i, y[i], q), part = e / g->e[i];
        w->e[i] = 0;
        if (!roln_finite(q)) return ROLN_E_NOT_FINITE;
        if (!roln_finite(y[i])) continue;
        in->measured++;
        if (g->gate > 0 && age > ROLN_MIN(32 * g->settle, 999999) && !(ROLN_ABS(part) <= g->gate)) continue; /* it has settled */
        in->used++, in->nis += part * part;
        w->e[i] = unit * e / (g->q[i] * g->q[i]);
    }
    if (2 * in->used < in->measured) in->used = 0;
    if (in->used == 0) return ROLN_OK;
    roln_ae_reduce(&ROLN_(model).ae, 1, p->theta, w->u.decode.tape, w->e, w->b, w->u.decode.work);
    ROLNI_(observer_move)(p, g, age, w->b, w->s, w->d);
    for (i = 0; i < n; i++)
        if (roln_lnn_angle(&ROLN_(model).lnn, i)) w->s[i] = roln_wrap(w->s[i]);
    return roln_all_finite(2 * n, w->s) && roln_finite(in->nis) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* At the pose y, at rest; joints that were not measured as in z [n], NULL: none may be missing. */
ROLN_FN uint32_t ROLNI_(observer_start)(const ROLN_(params) *p, const roln_real *y, const roln_real *z, roln_real *zdd,
                                        ROLN_(observer_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_real *const x = w->x;
    int i;
    if (zdd) rolni_zero(n, zdd);
    if (!z && !roln_all_finite(N, y)) return ROLN_FILTER_NONE;
    for (i = 0; i < n; i++)
        if (!(p->z_max[i] > p->z_min[i]) || !(p->zd_max[i] > 0)) return ROLN_FAULT_RANGE | ROLN_FILTER_NONE;
    rolni_zero(n, w->b);
    if (z && ROLNI_(decode)(p, z, w->b, x, w->u.decode.tape, w->u.decode.s) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    for (i = 0; i < N; i++)
        x[i] = roln_finite(y[i]) ? y[i] : x[i];
    rolni_zero(N, x + N);
    if (ROLNI_(encode)(p, x, x + N, NULL, w->s, w->u.encode) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    return ROLN_FILTER_START;
}

/* A tick on from the estimate of o: the model's step under tau, and what y says, NULL: nothing. */
ROLN_FN uint32_t ROLNI_(observer_follow)(const ROLN_(params) *p, const ROLN_(observer_gains) *g, const roln_real *y,
                                         const roln_real *tau, rolni_innovation *in, ROLN_(observer) *o,
                                         ROLN_(observer_tick_work) *w)
{
    const int n = ROLN_(n);
    roln_real *const zdd = ROLNI_LAST_OF_OBSERVER(o);
    rolni_push by;
    roln_status st;
    int i;
    by.tau = tau, by.load = NULL, by.dt = g->dt, by.how = ROLNI_LOOK;
    rolni_copy(n, o->s.z, w->s);
    rolni_copy(n, o->s.zd, w->s + n);
    ROLNI_(leap_begin)(g->dt, zdd, w->s, w->d);
    st = ROLNI_(step_by)(p, w->s, w->s + n, &by, &w->u.step.base, w->u.step.tape, w->u.step.work);
    ROLNI_(leap_end)(g->dt, w->d, zdd, w->s);
    for (i = 0; i < n && st == ROLN_OK; i++)
        if (roln_lnn_angle(&ROLN_(model).lnn, i)) w->s[i] = roln_wrap(w->s[i]);
    o->age += o->age < 1000000;
    if (st == ROLN_OK && y) st = ROLNI_(observer_correct)(p, g, o->age, y, in, w);
    if (st == ROLN_OK && !ROLNI_(in_range)(p, 10, w->s, w->s + n)) st = ROLN_E_RANGE;
    if (st == ROLN_OK) return 0;
    o->f.valid = 0;
    return ROLN_FAULT_STATUS;
}

/* One tick of an observer with steady gains: z, zd from positions alone, without derivatives of the model.
       predict    one step of leapfrog under tau, that of ROLN_FILTER leapfrog (with ROLN_STICTION the model's own step)
       correct    (z, zd) += P(z) J^T R^-1 (y - phi(z)), R = diag(g->q^2), P from g
   P is what the covariance of NAME_filter_tick settles at, at rest, at eight states, between which it is a mean; after a start that
   of a filter with 64 times the unknown torque, which becomes the steady one. An observer trusts the model as much after a gap as
   before, and estimates no load. The gate is open until 32 g->settle ticks after a start, a million at most.
   y, tau, starts, lost ticks, outliers and the bits returned: as NAME_filter_tick, but f.nis counts joints as if they were
   independent. ROLN_FAULT_INPUT with ROLN_FILTER_NONE also if g is empty.
   Cost: a step of leapfrog, a decoding and a reduction, 8 n (2 n + 3) multiply-adds. */
ROLN_FN uint32_t ROLN_(observer_tick)(const ROLN_(params) *p, const ROLN_(observer_gains) *g, const roln_real y[ROLN_(N)],
                                      const roln_real tau[ROLN_(force_size)], ROLN_(observer) *o, ROLN_(observer_tick_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_filter *const filter = &o->f;
    rolni_innovation in = {0, 0, 0};
    uint32_t faults = 0;
    const roln_real set[3] = {g->dt, g->gate, g->settle};
    int i, measured = 0, valid = roln_all_finite(3, set) && g->dt > 0 && g->gate >= 0 && g->settle >= 0 && g->lost >= 0;
    if (ROLN_(params_mismatch)(p)) {
        filter->faults |= ROLN_FAULT_STATUS;
        return ROLN_FAULT_STATUS;
    }
    for (i = 0; i < N; i++) {
        const roln_real square = g->q[i] * g->q[i]; /* it divides */
        valid &= g->q[i] > 0 && square > 0 && roln_finite(square) && g->e[i] > 0 && roln_finite(g->e[i]);
    }
    if (!valid) {
        filter->faults |= ROLN_FAULT_INPUT | ROLN_FILTER_NONE;
        return ROLN_FAULT_INPUT | ROLN_FILTER_NONE;
    }
    if (tau && !roln_all_finite(ROLN_(force_size), tau)) faults |= ROLN_FAULT_INPUT, tau = NULL;
    for (i = 0; y && i < N; i++)
        measured += roln_finite(y[i]) != 0;
    if (measured < N) faults |= ROLN_FILTER_MISSING;
    if (filter->valid) faults |= ROLNI_(observer_follow)(p, g, measured > 0 ? y : NULL, tau, &in, o, w);
    faults |= rolni_filter_lost(filter, g->lost, n, &in);
    if (!filter->valid) {
        in.used = 0;
        if (measured == 0) faults |= ROLN_FILTER_NONE;
        else faults |= ROLNI_(observer_start)(p, y, filter->starts && measured < N ? o->s.z : NULL,
                                              ROLNI_LAST_OF_OBSERVER(o), w);
        if (rolni_filter_starts(filter, faults)) in.used = measured, in.nis = 0, o->age = 0;
    }
    if (filter->valid) {
        if (!ROLNI_(in_range)(p, 0, w->s, w->s + n)) faults |= ROLN_FAULT_RANGE;
        rolni_copy(n, w->s, o->s.z);
        rolni_copy(n, w->s + n, o->s.zd);
    }
    filter->used = in.used, filter->nis = in.used > 0 ? in.nis : 0;
    filter->faults |= faults;
    return faults;
}

/* scratch of NAME_doubt: terms */
typedef struct { roln_real t[ROLN_(terms)]; } ROLN_(doubt_work);

/* How far the model can be off at a state: its novelty, and the standard deviations of the acceleration zdd and of the force on z
   that the model says there; without NAME_fit_doubt these are unknown, and 0. ROLN_E_RANGE: e has seen no state, or e->halves is
   not within 0 .. 8; ROLN_E_NOT_FINITE. d is untouched unless ROLN_OK. Cost with n = 4: 5,900 multiply-adds and 124
   divisions. */
ROLN_FN roln_status ROLN_(doubt)(const ROLN_(params) *p, const ROLN_(evidence) *e, const ROLN_(latent) *s, ROLN_(doubts) *d,
                                 ROLN_(doubt_work) *w)
{
    const int n = ROLN_(n);
    roln_real novelty, grown = 1, root;
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!(e->count > 0) || e->halves < 0 || e->halves > ROLNI_GROWTHS + 1) return ROLN_E_RANGE;
    novelty = ROLNI_(novelty)(p, e->L, s->z, s->zd, w->t);
    root = ROLN_SQRT(novelty);
    for (i = 0; i < e->halves; i++)
        grown *= root;
    root = ROLN_SQRT(grown);
    for (i = 0; i < 2 * n; i++) { /* no square that is too small or too large for its type */
        const roln_real a = ROLN_ABS(e->always[i]), b = ROLN_ABS(e->grows[i]) * root, most = ROLN_MAX(a, b);
        const roln_real ratio = most > 0 ? ROLN_MIN(a, b) / most : 0;
        w->t[i] = most * ROLN_SQRT(1 + ratio * ratio);
        if (!roln_finite(a) || !roln_finite(b)) return ROLN_E_NOT_FINITE;
    }
    if (!roln_finite(novelty) || !roln_all_finite(2 * n, w->t)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, w->t, d->zdd);
    rolni_copy(n, w->t + n, d->force);
    d->novelty = novelty;
    return ROLN_OK;
}

/* scratch of NAME_doubt_ahead */
typedef struct {
    ROLN_(latent) s;
    ROLN_(doubts) d;
    ROLN_(outlook) o;
    roln_real moved[4 * ROLN_(n) * ROLN_(n)], g[2 * ROLN_(n)];
    union {
        ROLN_(doubt_work) doubt;
        struct {
            ROLN_(jacobian) j;
            ROLN_(linear_work) work;
        } linear;
    } u;
} ROLN_(doubt_ahead_work);

/* A step from s to w->s; w->d and the Jacobian w->u.linear.j are those at s. */
ROLN_FN roln_status ROLNI_(doubt_step)(const ROLN_(params) *p, const ROLN_(evidence) *e, const ROLN_(latent) *s,
                                       const roln_real *tau, roln_real dt, ROLN_(doubt_ahead_work) *w)
{
    const roln_status st = ROLN_(doubt)(p, e, s, &w->d, &w->u.doubt);
    w->s = *s;
    return st != ROLN_OK ? st : ROLN_(linear)(p, &w->s, tau, dt, &w->u.linear.j, &w->u.linear.work);
}

/* A step of the covariances of NAME_doubt_ahead: with G = [dt^2 / 2; dt] diag(zdd of d) and a, r, m of rolni_alike
       P+ = A P A^T + a (A C G^T + G C^T A^T) + m G G^T,   C+ = r A C + a G.
   A [2n][2n]; from in, to out; g [2n], moved [2n][2n]: scratch. */
ROLN_FN void ROLNI_(spread)(const roln_real *A, const ROLN_(doubts) *d, roln_real dt, roln_real lasts, const ROLN_(outlook) *from,
                            ROLN_(outlook) *to, roln_real *g, roln_real *moved)
{
    const int n = ROLN_(n), n2 = 2 * n;
    const rolni_alikeness x = rolni_alike(dt / lasts);
    roln_real *const P = to->P, *const C = to->C;
    int i, j;
    for (i = 0; i < n; i++)
        g[i] = dt * dt / 2 * d->zdd[i], g[n + i] = dt * d->zdd[i];
    roln_mm(n2, n2, n2, A, from->P, moved);
    roln_mm_bt(n2, n2, n2, moved, A, P);
    roln_mm(n2, n2, n, A, from->C, C);
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            P[i * n2 + j] += x.mean * (C[i * n + j % n] * g[j] + g[i] * C[j * n + i % n]) +
                             (i % n == j % n ? x.means * g[i] * g[j] : 0);
    for (i = 0; i < n2 * n; i++)
        C[i] *= x.ends;
    for (i = 0; i < n2; i++)
        C[i * n + i % n] += x.mean * g[i];
}

/* NAME_step, and the covariance o->P of the state where it ends, of errors of the acceleration that NAME_doubt expects on the way.
   They are S x, S = diag(zdd), with numbers x of variance 1 and correlation exp(-t / e->lasts). With G = [dt^2 / 2; dt] S,
   u = dt / lasts, r = exp(-u), a = (1 - r) / u, m = 2 (1 - a) / u and C = E[(z, zd) x^T] it is, linearised,
       P+ = A P A^T + a (A C G^T + G C^T A^T) + m G G^T,   C+ = r A C + a G.
   Deviations of z, zd are the roots of the diagonal of P. s and o are untouched unless ROLN_OK. Status of NAME_doubt, NAME_linear;
   ROLN_E_RANGE also if dt < 0, or e->lasts is 0, as it is until NAME_fit_outlook sets it;
   ROLN_E_NOT_SPD: a variance has become negative by rounding, in a roll-out that has gone astray. Cost: NAME_linear, NAME_doubt and
   20 n^3 multiply-adds. */
ROLN_FN roln_status ROLN_(doubt_ahead)(const ROLN_(params) *p, const ROLN_(evidence) *e, ROLN_(latent) *s,
                                       const roln_real tau[ROLN_(force_size)], roln_real dt, ROLN_(outlook) *o,
                                       ROLN_(doubt_ahead_work) *w)
{
    const int n2 = 2 * ROLN_(n);
    roln_status st;
    int i;
    if (!(dt >= 0) || !(e->lasts > 0)) return ROLN_E_RANGE;
    st = ROLNI_(doubt_step)(p, e, s, tau, dt, w);
    if (st != ROLN_OK) return st;
    ROLNI_(spread)(w->u.linear.j.A, &w->d, dt, e->lasts, o, &w->o, w->g, w->moved);
    if (!roln_all_finite(n2 * n2, w->o.P)) return ROLN_E_NOT_FINITE; /* and C, of which every number has gone into P */
    for (i = 0; i < n2; i++)
        if (w->o.P[i * n2 + i] < 0) return ROLN_E_NOT_SPD;
    *o = w->o, *s = w->s;
    return ROLN_OK;
}

#if ROLNI_AT(0, ROLN_PLAN) > 0
/* ---- 13 plans -------------------------------------------------------------------------------- */

/* scratch of a goal: how far ahead of a state limits are judged; the joints x at the state and the gradient gx by them, J there, a
   row of derivatives, the decoder's tape */
typedef struct {
    roln_real ahead[2 * ROLN_(n)];
    roln_real x[2 * ROLN_(N)], gx[2 * ROLN_(N)], J[ROLN_(N) * ROLN_(n)], row[2 * ROLN_(n)];
    roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
    union {
        ROLNI_(pose_work) pose;
        roln_real bwd[ROLNI_ROOM(ROLN_AE_DECODE_BWD_WORK(ROLN_, 2, 1))];
    } u;
} ROLNI_(goal_work);

/* scratch of NAME_plan_next: a base s0 under u0, derivatives Q, q along it, what roln_ocp_solve makes of them and of the plan's A,
   B: u, x, K, and what comes of that, s1 under u1. top, rate, last, hold, r: limits, a change of torque in a step, the torque
   before the first step, what the goal holds, twice its weight. model: ROLNI_(plan_model). */
typedef struct {
    roln_real s0[(ROLN_(steps) + 1) * 2 * ROLN_(n)], s1[(ROLN_(steps) + 1) * 2 * ROLN_(n)], x[(ROLN_(steps) + 1) * 2 * ROLN_(n)];
    roln_real u0[ROLN_(steps) * ROLN_(motors)], u1[ROLN_(steps) * ROLN_(motors)], u[ROLN_(steps) * ROLN_(motors)];
    roln_real Q[ROLN_(steps) * 4 * ROLN_(n) * ROLN_(n)], q[ROLN_(steps) * 2 * ROLN_(n)];
    roln_real K[ROLN_(steps) * ROLN_(motors) * 2 * ROLN_(n)];
    roln_real top[ROLN_(motors)], rate[ROLN_(motors)], last[ROLN_(motors)], r[ROLN_(motors)], hold[ROLN_(motors)], tau[ROLN_(N)];
    roln_bits model;
    union {
        ROLNI_(linear_motors_work) linear;
        ROLN_(step_work) step;
        ROLNI_(goal_work) goal;
        roln_real ocp[ROLN_OCP_WORK(2 * ROLN_(n), ROLN_(motors), ROLN_(steps), 1)];
    } now;
} ROLN_(plan_next_work);

/* Status of the numbers, count a step, that a term is about: a reference, or limits. */
ROLN_FN roln_status ROLNI_(term_check)(const roln_term *t, int count)
{
    const int steps = ROLN_(steps);
    int i;
    if (count > 0 && !t->low && !t->high && !t->ref) return ROLN_E_LENGTH;
    if (!t->low && !t->high) return roln_all_finite((t->moving ? steps : 1) * count, t->ref) ? ROLN_OK : ROLN_E_NOT_FINITE;
    for (i = 0; i < count; i++) {
        if (t->low && !roln_finite(t->low[i]) && !(t->low[i] < 0)) return ROLN_E_NOT_FINITE;
        if (t->high && !roln_finite(t->high[i]) && !(t->high[i] > 0)) return ROLN_E_NOT_FINITE;
        if (t->low && t->high && t->low[i] > t->high[i]) return ROLN_E_RANGE;
    }
    if (t->tighten && !roln_all_finite(steps * count, t->tighten)) return ROLN_E_NOT_FINITE;
    for (i = 0; t->tighten && i < steps * count; i++)
        if (t->tighten[i] < 0) return ROLN_E_RANGE;
    return ROLN_OK;
}

/* Status of a goal: ROLN_E_LENGTH: sizes, motors, an array that is missing; ROLN_E_NOT_FINITE; ROLN_E_NOT_SPD: a weight;
   ROLN_E_RANGE: dt, limits, reserve. L [2n][2n] is written. */
ROLN_FN roln_status ROLNI_(goal_check)(const roln_goal *g, roln_real *L)
{
    const int N = ROLN_(N), n = ROLN_(n), motors = ROLN_(motors);
    int i, k;
    if (!rolni_motors_valid(&ROLN_(model), g->limits->motors)) return ROLN_E_LENGTH;
    if (motors != rolni_torques(&ROLN_(model), g->limits->motors)) return ROLN_E_LENGTH;
    if (g->terms < 0 || g->iterations < 0 || g->iterations > ROLN_PLAN_ITERATIONS) return ROLN_E_LENGTH;
    if (!roln_finite(g->dt)) return ROLN_E_NOT_FINITE;
    if (!(g->dt > 0) || !rolni_limits_valid(g->limits, motors)) return ROLN_E_RANGE;
    if (g->hold && !roln_all_finite(motors, g->hold)) return ROLN_E_NOT_FINITE;
    if (g->load && !roln_all_finite(n, g->load)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < motors; i++) {
        if (!(g->u[i] > 0)) return roln_finite(g->u[i]) ? ROLN_E_NOT_SPD : ROLN_E_NOT_FINITE;
        if (!(rolni_most(g->limits, i) > 0)) return ROLN_E_RANGE;
    }
    if (g->reserve && !roln_all_finite(ROLN_(steps) * motors, g->reserve)) return ROLN_E_NOT_FINITE;
    for (i = 0; g->reserve && i < ROLN_(steps) * motors; i++)
        if (!(g->reserve[i] >= 0 && g->reserve[i] < rolni_most(g->limits, i % motors))) return ROLN_E_RANGE;
    for (k = 0; k < g->terms; k++) {
        const roln_term *t = g->term + k;
        const int count = t->C ? t->count : t->of < ROLN_OF_Z ? N : n;
        roln_status st;
        if (t->of < ROLN_OF_Q || t->of > ROLN_OF_ZD || count < 0 || (count > 0 && !t->weight)) return ROLN_E_LENGTH;
        if (!roln_all_finite(count, t->weight) || (t->C && !roln_all_finite(count * (t->of < ROLN_OF_Z ? N : n), t->C)) ||
            !roln_finite(t->last))
            return ROLN_E_NOT_FINITE;
        if ((st = ROLNI_(term_check)(t, count)) != ROLN_OK) return st;
        for (i = 0; i < count; i++)
            if (t->weight[i] < 0 || t->last < 0) return ROLN_E_NOT_SPD;
    }
    if (!g->P) return ROLN_OK;
    if (!g->end) return ROLN_E_LENGTH;
    return roln_all_finite(2 * n, g->end) ? rolni_goal_weighs(2 * n, g->P, L) : ROLN_E_NOT_FINITE;
}

/* Derivatives of output i of a term by the n coordinates or velocities that it is of (Gauss-Newton); w->row is scratch. */
ROLN_FN const roln_real *ROLNI_(goal_row)(const roln_term *f, int i, ROLNI_(goal_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), joints = f->of < ROLN_OF_Z;
    const roln_real *const c = f->C ? f->C + i * (joints ? N : n) : NULL;
    if (joints && !c) return w->J + i * n;
    if (!joints && c) return c;
    if (joints) roln_mm(1, N, n, c, w->J, w->row);
    else {
        rolni_zero(n, w->row);
        w->row[i] = 1;
    }
    return w->row;
}

/* Output i of a term, off by e: to its gradient and, by way of its row of derivatives, to Q. */
ROLN_FN void ROLNI_(goal_push)(const roln_term *f, int i, roln_real weight, roln_real e, roln_real *Q, roln_real *q,
                               ROLNI_(goal_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    const int joints = f->of < ROLN_OF_Z, fast = f->of == ROLN_OF_QD || f->of == ROLN_OF_ZD, side = joints ? N : n;
    const roln_real *const c = f->C ? f->C + i * side : NULL;
    roln_real *const to = joints ? w->gx + fast * N : q + fast * n;
    const roln_real *row;
    int j, k;
    Q += fast * (2 * n + 1) * n;
    for (j = 0; j < side && c; j++)
        to[j] += 2 * weight * e * c[j];
    if (!c) to[i] += 2 * weight * e;
    if (!joints && !c) {
        Q[i * (2 * n + 1)] += 2 * weight;
        return;
    }
    row = ROLNI_(goal_row)(f, i, w);
    for (j = 0; j < n; j++)
        for (k = 0; k < n; k++)
            Q[j * 2 * n + k] += 2 * weight * row[j] * row[k];
}

/* The turn of x next to y, output i of a term, if that is an angle; else x. */
ROLNI_INLINE roln_real ROLNI_(goal_near)(const roln_term *f, int i, roln_real y, roln_real x)
{
    const int turns = !f->C && f->of != ROLN_OF_QD && f->of != ROLN_OF_ZD && i < ROLN_(n);
    return turns ? roln_lnn_near(&ROLN_(model).lnn, i, y, x) : x;
}

/* How far output i of a term, y, is beyond its low (0) or high (1) behind step k, to *e. Returns whether that costs, where y is
   judged `ahead` of itself. */
ROLN_FN int ROLNI_(goal_beyond)(const roln_term *f, int k, int i, int high, roln_real y, roln_real ahead, roln_real *e)
{
    const int count = f->C ? f->count : f->of < ROLN_OF_Z ? ROLN_(N) : ROLN_(n);
    const roln_real *const limit = high ? f->high : f->low, *const other = high ? f->low : f->high;
    const roln_real inside = f->tighten ? f->tighten[k * count + i] : 0;
    roln_real to, middle;
    if (!limit || !roln_finite(limit[i])) return 0;
    to = limit[i] + (high ? -inside : inside);
    middle = other && roln_finite(other[i]) ? limit[i] / 2 + other[i] / 2 : limit[i];
    *e = y - to - (ROLNI_(goal_near)(f, i, y, middle) - middle);
    return high ? *e + ahead > 0 : *e + ahead < 0;
}

/* The cost of all terms but the last one's, P, of the state s behind step k; Q NULL: without derivatives. */
ROLN_FN roln_real ROLNI_(goal_terms)(const roln_goal *g, int k, const roln_real *s, roln_real *Q, roln_real *q,
                                     ROLNI_(goal_work) *w)
{
    const int n = ROLN_(n), end = k == ROLN_(steps) - 1;
    roln_real sum = 0;
    int t, i;
    for (t = 0; t < g->terms; t++) {
        const roln_term *f = g->term + t;
        const int joints = f->of < ROLN_OF_Z, fast = f->of == ROLN_OF_QD || f->of == ROLN_OF_ZD, side = joints ? ROLN_(N) : n;
        const int count = f->C ? f->count : side, limit = f->low || f->high;
        const roln_real *const at = (joints ? w->x : s) + fast * side;
        const roln_real *const ref = limit ? NULL : f->ref + (f->moving ? k * count : 0);
        for (i = 0; i < count; i++) {
            const roln_real c = f->weight[i] * (end ? 1 + f->last : 1), y = f->C ? roln_dot(side, f->C + i * side, at) : at[i];
            roln_real e, ahead = 0;
            int high;
            if (!(c > 0)) continue;
            if (ref) {
                e = y - ROLNI_(goal_near)(f, i, y, ref[i]);
                sum += c * e * e;
                if (Q) ROLNI_(goal_push)(f, i, c, e, Q, q, w);
                continue;
            }
            if (Q) ahead = roln_dot(n, ROLNI_(goal_row)(f, i, w), w->ahead + fast * n);
            for (high = 0; high <= 1; high++) {
                if (!ROLNI_(goal_beyond)(f, k, i, high, y, ahead, &e)) continue;
                sum += c * e * e;
                if (Q) ROLNI_(goal_push)(f, i, c, e, Q, q, w);
            }
        }
    }
    return sum;
}

/* (s - end)^T P (s - end); Q NULL: without derivatives. */
ROLN_FN roln_real ROLNI_(goal_end)(const roln_goal *g, const roln_real *s, roln_real *Q, roln_real *q, ROLNI_(goal_work) *w)
{
    const int n = ROLN_(n);
    roln_real *const row = w->row, sum = 0;
    int i, j;
    for (i = 0; i < 2 * n; i++)
        row[i] = s[i] - (i < n ? roln_lnn_near(&ROLN_(model).lnn, i, s[i], g->end[i]) : g->end[i]);
    for (i = 0; i < 2 * n; i++) {
        const roln_real y = roln_dot(2 * n, g->P + i * 2 * n, row);
        sum += row[i] * y;
        if (Q) q[i] += 2 * y;
        for (j = 0; j < 2 * n && Q; j++)
            Q[i * 2 * n + j] += 2 * g->P[i * 2 * n + j];
    }
    return sum;
}

/* Adds to *cost that of s [2n], the state behind step k; unless Q is NULL, q [2n] becomes its gradient, and Q [2n][2n] its Hessian
   but for what it owes to how decoders bend (Gauss-Newton). With Q it reads w->ahead [2n]: limits count as beyond which s + ahead
   is, to first order. */
ROLN_FN roln_status ROLNI_(goal_at)(const ROLN_(params) *p, const roln_goal *g, int k, const roln_real *s, roln_real *cost,
                                    roln_real *Q, roln_real *q, ROLNI_(goal_work) *w)
{
    const roln_real *each = ROLNI_EACH(p);
    const int N = ROLN_(N), n = ROLN_(n);
    int i, joints = 0;
    for (i = 0; i < g->terms; i++)
        joints |= g->term[i].of < ROLN_OF_Z;
    if (joints) {
        roln_status st = ROLNI_(decode)(p, s, s + n, w->x, w->tape, w->row);
        if (st == ROLN_OK && Q) st = ROLNI_(pose)(p, s, w->gx, w->J, &w->u.pose); /* q, once more, is not read */
        if (st != ROLN_OK) return st;
    }
    rolni_zero(2 * N, w->gx);
    if (Q) rolni_zero(4 * n * n, Q), rolni_zero(2 * n, q);
    *cost += ROLNI_(goal_terms)(g, k, s, Q, q, w);
    if (k == ROLN_(steps) - 1 && g->P) *cost += ROLNI_(goal_end)(g, s, Q, q, w);
    for (i = 0; i < 2 * N && Q; i++)
        w->gx[i] *= p->scale.q * (each ? each[i % N] : 1);
    if (joints && Q) roln_ae_decode_bwd(&ROLN_(model).ae, 2, 1, p->theta, w->tape, w->gx, q, NULL, w->u.bwd);
    return roln_finite(*cost) && (!Q || (roln_all_finite(2 * n, q) && roln_all_finite(4 * n * n, Q))) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* The limit of the torque of motor j in step k, as roln_ocp_solve has it, and whatever bits there are, within its own. */
ROLN_FN roln_real ROLNI_(plan_top)(const roln_goal *g, const ROLN_(plan_next_work) *w, int k, int j)
{
    const roln_real last = rolni_rated(g->limits) ? ROLN_ABS(w->last[j]) : 0;
    const roln_real fall = ROLN_MIN(last, ROLNI_AS(roln_real, k + 1) * (w->rate[j] / 4));
    const roln_real top = g->reserve ? rolni_ocp_lower(w->top[j], g->reserve[k * ROLN_(motors) + j], last, fall) : w->top[j];
    return ROLN_MIN(top, w->top[j]);
}

/* u of motor j within limits in step k, after last; NaN of NaN. A limit of rate is kept before a reserve, and the limit of torque
   before both, for any bits. */
ROLN_FN roln_real ROLNI_(plan_clip)(const roln_goal *g, const ROLN_(plan_next_work) *w, int k, int j, roln_real last, roln_real u)
{
    const roln_real top = ROLNI_(plan_top)(g, w, k, j), most = w->top[j];
    const roln_real down = last - w->rate[j], up = last + w->rate[j]; /* stored: compared as rounded */
    u = u < -top ? -top : u > top ? top : u;
    if (rolni_rated(g->limits)) u = u < down ? down : u > up ? up : u;
    return u < -most ? -most : u > most ? most : u;
}

/* u0 of step k to begin with: that of the last plan, a step on, with its feedback, or hold. */
ROLN_FN void ROLNI_(plan_guess)(const roln_goal *g, const ROLN_(plan) *plan, int k, ROLN_(plan_next_work) *w)
{
    const int n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors), steps = ROLN_(steps), next = ROLN_MIN(k + 1, steps - 1);
    const int known = plan->plan.valid && plan->plan.age == 0;
    const roln_real *s = w->s0 + k * n2, *planned = ROLNI_(numbers)(plan->s + k + 1);
    int i, j;
    for (j = 0; j < motors; j++) {
        const roln_real *K = plan->K + (next * motors + j) * n2;
        roln_real u = known ? plan->u[next * motors + j] : w->hold[j];
        for (i = 0; i < n2 && known && k + 1 < steps; i++)
            u -= K[i] * ((i < n ? roln_lnn_near(&ROLN_(model).lnn, i, planned[i], s[i]) : s[i]) - planned[i]);
        w->u0[k * motors + j] = ROLNI_(plan_clip)(g, w, k, j, k > 0 ? w->u0[(k - 1) * motors + j] : w->last[j], u);
    }
}

/* A checksum of the model of whose steps derivatives are kept, never 0: parameters, dt, motors. */
ROLN_FN roln_bits ROLNI_(plan_model)(const ROLN_(params) *p, const roln_goal *g)
{
    const roln_motors *f = g->limits->motors;
    const roln_real *const B = f ? f->B : NULL; /* NULL, too, if the model has learned it */
    const void *const numbers = p;
    roln_bits sum = rolni_mark(1, &g->dt, 0);
    sum = rolni_mark(ROLNI_AS(int, sizeof *p / sizeof(roln_real)), ROLNI_AS(const roln_real *, numbers), sum);
    if (B) sum = rolni_mark(ROLN_(N) * ROLN_(motors), B, sum);
    return sum | 1;
}

/* The derivatives of a step are used again if the state has moved by at most this part of the range seen in training, and the
   torques by what changes zd by at most this part of its largest value. */
#define ROLNI_PLAN_NEAR ROLN_C(0.0625)
/* The model's step may then differ from the expected one by this part of the expected change, and by this part of the range. */
#define ROLNI_PLAN_STRAIGHT ROLN_C(0.0625)
#define ROLNI_PLAN_LEAST ROLN_C(0.000244140625)

/* Nonzero if the derivatives of step k were computed nearby, with this model. Then x [2n] is the state that they expect after the
   step, and d [2n] is its change since they were computed. */
ROLN_FN int ROLNI_(plan_near)(const ROLN_(params) *p, const ROLN_(plan) *plan, int k, const ROLN_(plan_next_work) *w, roln_real *x,
                              roln_real *d)
{
    const int n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors);
    const roln_real *s = w->s0 + k * n2, *u = w->u0 + k * motors, *at = plan->at + k * (n2 + motors);
    int i, j, holds = plan->of[k] == w->model;
    for (i = 0; i < n2 && holds; i++)
        x[i] = s[i] - at[i];
    for (i = 0; i < n && holds; i++)
        holds = ROLN_ABS(x[i]) <= ROLNI_PLAN_NEAR * (p->z_max[i] - p->z_min[i]) &&
               ROLN_ABS(x[n + i]) <= ROLNI_PLAN_NEAR * p->zd_max[i];
    if (!holds) return 0;
    roln_mm_bt(1, n2, n2, x, plan->A + k * n2 * n2, d);
    for (i = 0; i < n2; i++) {
        roln_real push = 0;
        for (j = 0; j < motors; j++)
            push += plan->B[(k * n2 + i) * motors + j] * (u[j] - at[n2 + j]);
        if (i >= n && !(ROLN_ABS(push) <= ROLNI_PLAN_NEAR * p->zd_max[i - n])) return 0;
        d[i] += push, x[i] = plan->to[k * n2 + i] + d[i];
    }
    return 1;
}

/* Nonzero if the state s [2n] after a step is the expected one, x, with the change d (ROLNI_(plan_near)). */
ROLN_FN int ROLNI_(plan_straight)(const ROLN_(params) *p, const roln_real *s, const roln_real *x, const roln_real *d)
{
    const int n = ROLN_(n);
    int i, straight = 1;
    const roln_real most[2] = {rolni_largest(n, d), rolni_largest(n, d + n)};
    for (i = 0; i < 2 * n; i++) {
        const roln_real range = i < n ? p->z_max[i] - p->z_min[i] : p->zd_max[i - n];
        straight &= ROLN_ABS(s[i] - x[i]) <= ROLNI_PLAN_STRAIGHT * most[i >= n] + ROLNI_PLAN_LEAST * range;
    }
    return straight;
}

/* Step k of the base, from s0 under u0, and its derivatives, old or new. *kept: whether old ones are considered. It becomes 0 when
   old ones turn out to be wrong, so that a plan computes at most one step twice. */
ROLN_FN roln_status ROLNI_(plan_step)(const ROLN_(params) *p, const roln_goal *g, ROLN_(plan) *plan, int k, int *kept,
                                      ROLN_(plan_next_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors);
    roln_real *const from = w->s0 + k * n2, *const s = from + n2, *const u = w->u0 + k * motors;
    roln_real *const at = plan->at + k * (n2 + motors);
    rolni_acting by;
    roln_status st;
    rolni_copy(n2, from, s);
    if (*kept && ROLNI_(plan_near)(p, plan, k, w, w->x, w->x + n2)) {
        rolni_push push;
        push.tau = rolni_motors_tau(N, g->limits->motors, u, w->tau), push.load = g->load, push.dt = g->dt, push.how = 0;
        st = ROLNI_(step)(p, s, s + n, &push, &w->now.step);
        if (st != ROLN_OK) return st;
        if (ROLNI_(plan_straight)(p, s, w->x, w->x + n2)) return ROLN_OK;
        *kept = 0;
        rolni_copy(n2, from, s);
    }
    plan->of[k] = 0;
    by.motors = g->limits->motors, by.u = u, by.load = g->load, by.dt = g->dt;
    st = ROLNI_(linear_motors)(p, &by, s, plan->A + k * n2 * n2, plan->B + k * n2 * motors, &w->now.linear);
    if (st != ROLN_OK) return st;
    rolni_copy(n2, from, at);
    rolni_copy(motors, u, at + n2);
    rolni_copy(n2, s, plan->to + k * n2);
    plan->of[k] = w->model;
    return ROLN_OK;
}

/* The base: u0 from the plan, if `guess`, else given; the states s0 under it, A, B, Q, q along it, its cost; *in: it stays in
   range. */
ROLN_FN roln_status ROLNI_(plan_base)(const ROLN_(params) *p, const roln_goal *g, ROLN_(plan) *plan, int guess, roln_real *cost,
                                      int *in, ROLN_(plan_next_work) *w)
{
    const int n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors);
    int k, j, kept = 1;
    *cost = 0, *in = 1;
    w->model = ROLNI_(plan_model)(p, g);
    for (k = 0; k < ROLN_(steps); k++) {
        roln_real *const s = w->s0 + (k + 1) * n2;
        roln_status st;
        if (guess) ROLNI_(plan_guess)(g, plan, k, w);
        st = ROLNI_(plan_step)(p, g, plan, k, &kept, w);
        rolni_zero(n2, w->now.goal.ahead);
        if (st == ROLN_OK) st = ROLNI_(goal_at)(p, g, k, s, cost, w->Q + k * n2 * n2, w->q + k * n2, &w->now.goal);
        if (st != ROLN_OK) return st;
        for (j = 0; j < motors; j++) {
            const roln_real e = w->u0[k * motors + j] - w->hold[j];
            *cost += w->r[j] / 2 * e * e;
        }
        *in &= ROLNI_(in_range)(p, g->limits->margin, s, s + n) != 0;
    }
    return roln_finite(*cost) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* The model under u0 + part (u - u0) and feedback, within all limits: s1 under u1. ROLN_E_RANGE: it leaves the range, or costs
   more than *most, which its first steps may tell, since no cost is negative; NULL: any cost will do. */
ROLN_FN roln_status ROLNI_(plan_try)(const ROLN_(params) *p, const roln_goal *g, roln_real part, const roln_real *most,
                                     roln_real *cost, ROLN_(plan_next_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors);
    rolni_push by;
    int k, i, j;
    by.load = g->load, by.dt = g->dt, by.how = 0;
    *cost = 0;
    rolni_copy(n2, w->s0, w->s1);
    for (k = 0; k < ROLN_(steps); k++) {
        const roln_real *const from = w->s1 + k * n2, *const u0 = w->u0 + k * motors;
        roln_real *const s = w->s1 + (k + 1) * n2, *const u = w->u1 + k * motors;
        roln_status st;
        for (j = 0; j < motors; j++) {
            roln_real to = u0[j] + part * (w->u[k * motors + j] - u0[j]);
            for (i = 0; i < n2; i++)
                to -= w->K[(k * motors + j) * n2 + i] * (from[i] - w->s0[k * n2 + i] - part * w->x[k * n2 + i]);
            u[j] = ROLNI_(plan_clip)(g, w, k, j, k > 0 ? u[j - motors] : w->last[j], to);
            *cost += w->r[j] / 2 * (u[j] - w->hold[j]) * (u[j] - w->hold[j]);
        }
        rolni_copy(n2, from, s);
        by.tau = rolni_motors_tau(N, g->limits->motors, u, w->tau);
        st = ROLNI_(step)(p, s, s + n, &by, &w->now.step);
        if (st == ROLN_OK) st = ROLNI_(goal_at)(p, g, k, s, cost, NULL, NULL, &w->now.goal);
        if (st != ROLN_OK) return st;
        if (!ROLNI_(in_range)(p, g->limits->margin, s, s + n) || (most && *cost > *most)) return ROLN_E_RANGE;
    }
    return roln_finite(*cost) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Limits and weights of the motors. Without a limit of its rate a torque may go from end to end of its own in a step. */
ROLN_FN void ROLNI_(plan_start)(const roln_goal *g, const ROLN_(plan) *plan, ROLN_(plan_next_work) *w)
{
    int j;
    for (j = 0; j < ROLN_(motors); j++) {
        const roln_real rate = rolni_rate(g->limits, j), top = rolni_most(g->limits, j);
        w->top[j] = top;
        w->rate[j] = rate > 0 ? rate * g->dt : 4 * ROLN_MIN(top, ROLN_C(1e37));
        w->r[j] = 2 * g->u[j];
        w->hold[j] = g->hold ? g->hold[j] : 0;
        w->last[j] = plan->plan.valid ? plan->u[plan->plan.age * ROLN_(motors) + j] : w->hold[j];
        w->last[j] = w->last[j] > top ? top : w->last[j] < -top ? -top : w->last[j];
    }
}

/* The optimum u, x of the linearised problem about the base, and its feedback K. */
ROLN_FN roln_status ROLNI_(plan_solve)(const roln_goal *g, const ROLN_(plan) *plan, roln_real *gap, ROLN_(plan_next_work) *w)
{
    const int rated = rolni_rated(g->limits);
    roln_ocp o;
    o.n = 2 * ROLN_(n), o.m = ROLN_(motors), o.steps = ROLN_(steps);
    o.A = plan->A, o.B = plan->B, o.Q = w->Q, o.q = w->q, o.r = w->r, o.ref = w->hold, o.at = w->u0;
    o.rate = rated ? w->rate : NULL, o.last = w->last, o.most = w->top, o.less = g->reserve;
    return roln_ocp_solve(&o, g->iterations > 0 ? g->iterations : rated ? 8 : 6, w->u, w->x, w->K, gap, w->now.ocp);
}

/* Solutions that may follow the first, because it is beyond limits of the state that the base keeps, or within others. */
#define ROLNI_PLAN_AGAIN 3

/* ROLNI_(plan_solve), and again while its solution is beyond other limits of the state than it was told to be. */
ROLN_FN roln_status ROLNI_(plan_within)(const ROLN_(params) *p, const roln_goal *g, const ROLN_(plan) *plan, roln_real *gap,
                                        ROLN_(plan_next_work) *w)
{
    const int n2 = 2 * ROLN_(n), steps = ROLN_(steps);
    roln_status st = ROLNI_(plan_solve)(g, plan, gap, w);
    int limits = 0, again, k;
    for (k = 0; k < g->terms; k++)
        limits |= g->term[k].low || g->term[k].high;
    for (again = 0; limits && again < ROLNI_PLAN_AGAIN && st == ROLN_OK; again++) {
        /* a limit that begins or ends to cost changes q, and Q, unless the other one does the opposite */
        const roln_bits told = rolni_mark(steps * n2, w->q, rolni_mark(steps * n2 * n2, w->Q, 0));
        roln_real cost = 0;
        for (k = 0; k < steps && st == ROLN_OK; k++) {
            const int to = (k + 1) * n2;
            rolni_copy(n2, w->x + to, w->now.goal.ahead);
            st = ROLNI_(goal_at)(p, g, k, w->s0 + to, &cost, w->Q + k * n2 * n2, w->q + k * n2, &w->now.goal);
        }
        if (st != ROLN_OK || rolni_mark(steps * n2, w->q, rolni_mark(steps * n2 * n2, w->Q, 0)) == told) return st;
        st = ROLNI_(plan_solve)(g, plan, gap, w);
    }
    return st;
}

/* The plan s1, u1: a whole, half or quarter step from the base (guess: ROLNI_(plan_base)) that costs less, else the base itself.
   If it is not a whole step, derivatives may be to blame, and none are kept. */
ROLN_FN roln_status ROLNI_(plan_better)(const ROLN_(params) *p, const roln_goal *g, ROLN_(plan) *plan, int guess, roln_real *cost,
                                        roln_real *gap, ROLN_(plan_next_work) *w)
{
    roln_real before, part;
    int in, k;
    roln_status st = ROLNI_(plan_base)(p, g, plan, guess, &before, &in, w);
    if (st == ROLN_OK) st = ROLNI_(plan_within)(p, g, plan, gap, w);
    if (st != ROLN_OK) return st;
    for (part = 1; part > ROLN_C(0.2); part /= 2) {
        if (ROLNI_(plan_try)(p, g, part, in ? &before : NULL, cost, w) == ROLN_OK) return ROLN_OK;
        for (k = 0; k < ROLN_(steps); k++)
            plan->of[k] = 0;
    }
    rolni_copy(ROLN_(steps) * ROLN_(motors), w->u0, w->u1);
    rolni_copy((ROLN_(steps) + 1) * 2 * ROLN_(n), w->s0, w->s1);
    *cost = before;
    return in ? ROLN_OK : ROLN_E_RANGE;
}

/* Derivatives that are kept of a step become those of the step before. Those of the last step stay there, too. */
ROLN_FN void ROLNI_(plan_shift)(ROLN_(plan) *plan)
{
    const int n2 = 2 * ROLN_(n), motors = ROLN_(motors), side = n2 + motors;
    int k;
    for (k = 0; k + 1 < ROLN_(steps); k++) {
        rolni_copy(n2 * n2, plan->A + (k + 1) * n2 * n2, plan->A + k * n2 * n2);
        rolni_copy(n2 * motors, plan->B + (k + 1) * n2 * motors, plan->B + k * n2 * motors);
        rolni_copy(side, plan->at + (k + 1) * side, plan->at + k * side);
        rolni_copy(n2, plan->to + (k + 1) * n2, plan->to + k * n2);
        plan->of[k] = plan->of[k + 1];
    }
}

/* The next plan, a step of dt after the last call, whether that found one or not; where a call was left out, set plan->plan.valid
   to 0 before the next: torques u_k that take the state s where the goal wants it, within the limits of the motors, at the least
   cost over steps of dt. It starts from the last plan with its feedback, linearises the model along it, solves what that gives for
   u (roln_ocp_solve), and lets the model move by it, with feedback; if that costs more than the last plan does, by half, and by a
   quarter of it: one iteration of Newton's method without second derivatives of the model (Gauss-Newton), with which the next call
   goes on (real-time iteration). With ROLN_STICTION states are those of NAME_step, and derivatives are those without dry friction,
   because a joint that is held has none. The first plan starts from hold, and so does one after a failure. Angles of a plan go on
   from those of s without a break; an angle of s that is more than two turns from 0 is first brought within (-pi, pi]. ROLN_OK:
   *plan is the new plan, or the last one, a step on, or hold, where the model finds none that is better. Else there is no new one:
   the last one has become a step older, or, at its end, is no longer known. ROLN_E_SHAPE: parameters that do not match;
   ROLN_E_RANGE: dt, limits (a tau of 0, too: leave out the column of B of a motor that is off), or all ways lead out of the range
   seen in training (limits->margin); ROLN_E_LENGTH: sizes, motors, a term without weight, or without ref and limits, P without end;
   ROLN_E_NOT_SPD: weights, or too far apart for the digits of the solver; ROLN_E_NOT_FINITE, of other numbers; status of
   NAME_linear, roln_ocp_solve. A limit of torque that is never reached may be any finite number. It changes a plan by rounding
   only, and so does another unit of a motor (test_plan.c: test_far, test_motor_units). If the solution is beyond other limits of
   the state (roln_term) than the base is, the problem is solved again with those, at most three times. Numbers that goal points
   to stay as they are during the call. The derivatives of each step are kept in *plan for the next call, which uses them again if
   the state there has hardly moved (docs/control.md, "Derivatives"). Cost: steps times NAME_step or, for new derivatives,
   NAME_linear, one to three times NAME_step, and roln_ocp_solve, with limits of the state one to four times. */
ROLN_FN roln_status ROLN_(plan_next)(const ROLN_(params) *p, const roln_goal *goal, const ROLN_(latent) *s, ROLN_(plan) *plan,
                                     ROLN_(plan_next_work) *w)
{
    const int n = ROLN_(n), n2 = 2 * n, steps = ROLN_(steps), motors = ROLN_(motors);
    roln_plan *const made = &plan->plan;
    roln_status st;
    roln_real cost = 0, gap = 0;
    if (made->age < 0 || made->age >= steps || !roln_all_finite(motors, plan->u + made->age * motors)) made->valid = made->age = 0;
    st = ROLN_(params_mismatch)(p) ? ROLN_E_SHAPE : ROLNI_(goal_check)(goal, w->Q);
    if (st == ROLN_OK && !roln_all_finite(n2, ROLNI_(numbers)(s))) st = ROLN_E_NOT_FINITE;
    if (st == ROLN_OK) {
        rolni_copy(n2, ROLNI_(numbers)(s), w->s0);
        rolni_turn_back(&ROLN_(model).lnn, 1, w->s0);
        ROLNI_(plan_start)(goal, plan, w);
        ROLNI_(plan_shift)(plan);
        st = ROLNI_(plan_better)(p, goal, plan, 1, &cost, &gap, w);
    }
    if (st != ROLN_OK) {
        if (made->valid && ++made->age >= steps) made->valid = made->age = 0;
        return st;
    }
    rolni_copy(steps * motors, w->u1, plan->u);
    rolni_copy(steps * motors * n2, w->K, plan->K);
    memcpy(plan->s, w->s1, sizeof plan->s);
    made->valid = 1, made->age = 0, made->cost = cost, made->duality_gap = gap;
    return ROLN_OK;
}

/* The torque of motor j a part f of a step after step k of a plan, at the state s, limited; NaN if that is no number. */
ROLN_FN roln_real ROLNI_(plan_want)(const roln_goal *goal, const ROLN_(plan) *plan, int k, roln_real f, int j,
                                    const ROLN_(latent) *s)
{
    const int n = ROLN_(n);
    const ROLN_(latent) *from = plan->s + k, *to = from + 1;
    const roln_real *K = plan->K + (k * ROLN_(motors) + j) * 2 * n;
    const roln_real top = rolni_most(goal->limits, j), dt = goal->dt, r = 1 - f;
    roln_real want = plan->u[k * ROLN_(motors) + j];
    int i;
    for (i = 0; i < n; i++) {
        const roln_real h0 = from->z[i], h1 = to->z[i], v0 = dt * from->zd[i], v1 = dt * to->zd[i];
        const roln_real z = h0 + f * f * (3 - 2 * f) * (h1 - h0) + f * r * (r * v0 - f * v1);
        want -= K[i] * (roln_lnn_near(&ROLN_(model).lnn, i, z, s->z[i]) - z);
        want -= K[n + i] * (s->zd[i] - (r * from->zd[i] + f * to->zd[i]));
    }
    return want < -top ? -top : want > top ? top : want;
}

/* The torques u [motors] t seconds after the last call of NAME_plan_next, at the measured state s:
       u = u_k - K_k (s - s_k(t)),   s_k(t) between s_k and s_k+1 (z by cubic Hermite polynomials, zd linearly)
   within limits->tau, but not limits->rate, by which u_k comes at once. ROLN_E_LENGTH: there is no plan, or it ends before t;
   ROLN_E_RANGE: dt, limits; ROLN_E_NOT_FINITE. Then u is untouched, and the guard is to be told so (want = NULL). No work. */
ROLN_FN roln_status ROLN_(plan_follow)(const ROLN_(params) *p, const roln_goal *goal, const ROLN_(plan) *plan, roln_real t,
                                       const ROLN_(latent) *s, roln_real u[ROLN_AT_LEAST(ROLN_(motors))])
{
    const roln_real at = t / goal->dt + ROLNI_AS(roln_real, plan->plan.age);
    roln_real want[ROLN_(motors)];
    int j, k;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!(goal->dt > 0) || !roln_finite(goal->dt) || !rolni_limits_valid(goal->limits, ROLN_(motors))) return ROLN_E_RANGE;
    if (!plan->plan.valid || !(at >= 0) || !(at < ROLNI_AS(roln_real, ROLN_(steps)))) return ROLN_E_LENGTH;
    if (!roln_all_finite(2 * ROLN_(n), ROLNI_(numbers)(s))) return ROLN_E_NOT_FINITE;
    k = ROLNI_AS(int, at);
    for (j = 0; j < ROLN_(motors); j++)
        want[j] = ROLNI_(plan_want)(goal, plan, k, at - ROLNI_AS(roln_real, k), j, s);
    if (!roln_all_finite(ROLN_(motors), want)) return ROLN_E_NOT_FINITE;
    rolni_copy(ROLN_(motors), want, u);
    return ROLN_OK;
}

/* scratch of NAME_plan_linear */
typedef struct {
    roln_real s[2 * ROLN_(n)];
    ROLNI_(linear_motors_work) linear;
} ROLN_(plan_linear_work);

/* The plan as others' solvers take it, s_k+1 = A_k s_k + B_k u_k + c_k: A [steps][2n][2n], B [steps][2n][motors], c [steps][2n], by
   rows, exact about the plan; A and B with ROLN_STICTION those without dry friction; joints' angles on the turns of the plan.
   ROLN_E_LENGTH: there is no plan, or motors; ROLN_E_NOT_FINITE: B or c; status of NAME_linear; then they hold no result. */
ROLN_FN roln_status ROLN_(plan_linear)(const ROLN_(params) *p, const roln_goal *goal, const ROLN_(plan) *plan, roln_real *A,
                                       roln_real *B, roln_real *c, ROLN_(plan_linear_work) *w)
{
    const int n2 = 2 * ROLN_(n), motors = ROLN_(motors);
    const roln_motors *f = goal->limits->motors;
    rolni_acting by;
    int k, i;
    by.motors = f, by.load = goal->load, by.dt = goal->dt;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!plan->plan.valid || !rolni_motors_valid(&ROLN_(model), f)) return ROLN_E_LENGTH;
    if (motors != rolni_torques(&ROLN_(model), f)) return ROLN_E_LENGTH;
    for (k = 0; k < ROLN_(steps); k++, A += n2 * n2, B += n2 * motors, c += n2) {
        const roln_real *u = plan->u + k * motors, *x = ROLNI_(numbers)(plan->s + k);
        roln_status st;
        rolni_copy(n2, x, w->s), by.u = u;
        if ((st = ROLNI_(linear_motors)(p, &by, w->s, A, B, &w->linear)) != ROLN_OK) return st;
        for (i = 0; i < n2; i++)
            c[i] = w->s[i] - roln_dot(n2, A + i * n2, x) - roln_dot(motors, B + i * motors, u);
        if (!roln_all_finite(n2 * motors, B) || !roln_all_finite(n2, c)) return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}

/* scratch of NAME_plan_tighten: A, B, closed loop and covariances of a step, P, C of NAME_outlook; a row and its product */
typedef struct {
    roln_real s[2 * ROLN_(n)], A[4 * ROLN_(n) * ROLN_(n)], B[2 * ROLN_(n) * ROLN_(motors)], moved[4 * ROLN_(n) * ROLN_(n)];
    ROLN_(outlook) o, next;
    ROLN_(doubts) d;
    roln_real row[2 * ROLN_(n)];
    union {
        ROLN_(doubt_work) doubt;
        ROLNI_(linear_motors_work) linear;
        ROLNI_(goal_work) goal;
    } u;
} ROLN_(plan_tighten_work);

/* The covariances o of the state behind step k under the plan's feedback, w->A becoming A - B K, with errors w->d.zdd that last so
   long. */
ROLN_FN void ROLNI_(tighten_step)(const ROLN_(plan) *plan, int k, roln_real dt, roln_real lasts, ROLN_(plan_tighten_work) *w)
{
    const int n2 = 2 * ROLN_(n), motors = ROLN_(motors);
    int i, j, l;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            for (l = 0; l < motors; l++)
                w->A[i * n2 + j] -= w->B[i * motors + l] * plan->K[(k * motors + l) * n2 + j];
    ROLNI_(spread)(w->A, &w->d, dt, lasts, &w->o, &w->next, w->row, w->moved);
    w->o = w->next;
}

/* The deviation of row [n2] times the state, with the covariance w->o.P. */
ROLN_FN roln_real ROLNI_(tighten_of)(const roln_real *row, ROLN_(plan_tighten_work) *w)
{
    const int n2 = 2 * ROLN_(n);
    roln_real variance;
    roln_mm(1, n2, n2, row, w->o.P, w->moved);
    variance = roln_dot(n2, w->moved, row);
    return variance < 0 ? 0 : ROLN_SQRT(variance); /* rounding may leave less than 0 */
}

/* How far limits are tightened along a plan for what the model does not know: `sigmas` standard deviations at each step. They are
   those of the outputs of `term` behind the step, to [steps][count], for its tighten; or, with term NULL, those of the torques
   that feedback adds where the step begins, to [steps][motors], for reserve of the goal: 0 in the first step. The errors of the
   acceleration are those of NAME_doubt along the plan, correlated in time as in NAME_doubt_ahead. The plan's feedback K takes a
   part of them back. With M = A - B K and a, m, r of NAME_doubt_ahead
       P+ = M P M^T + a (M C G^T + G C^T M^T) + m G G^T,   C+ = r M C + a G,
       to = sigmas (c P+ c^T)^(1/2) or sigmas (K P K^T)^(1/2),
   where c are the derivatives of an output by (z, zd), of qd by zd alone. A torque at its limit is no feedback, so pass a plan that
   reaches few limits. If many plans use the numbers, take the largest of several calls. A reserve may be as large as the limit of
   torque, which NAME_plan_next refuses. to holds no result unless ROLN_OK. ROLN_E_LENGTH: there is no plan, motors, or the term;
   ROLN_E_RANGE: sigmas < 0, dt, or e->lasts is 0 (NAME_fit_outlook); ROLN_E_NOT_FINITE; status of NAME_doubt, NAME_linear.
   Cost: of each step NAME_doubt, NAME_linear and 30 n^3 multiply-adds. */
ROLN_FN roln_status ROLN_(plan_tighten)(const ROLN_(params) *p, const ROLN_(evidence) *e, const roln_goal *goal,
                                        const ROLN_(plan) *plan, const roln_term *term, roln_real sigmas, roln_real *to,
                                        ROLN_(plan_tighten_work) *w)
{
    const int n = ROLN_(n), n2 = 2 * n, motors = ROLN_(motors);
    const int joints = term && term->of < ROLN_OF_Z, fast = term && (term->of == ROLN_OF_QD || term->of == ROLN_OF_ZD);
    const int count = !term ? motors : term->C ? term->count : joints ? ROLN_(N) : n;
    const roln_motors *f = goal->limits->motors;
    rolni_acting by;
    int k, i;
    by.motors = f, by.load = goal->load, by.dt = goal->dt;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!plan->plan.valid || !rolni_motors_valid(&ROLN_(model), f) || motors != rolni_torques(&ROLN_(model), f))
        return ROLN_E_LENGTH;
    if (term && (term->of < ROLN_OF_Q || term->of > ROLN_OF_ZD || count < 0)) return ROLN_E_LENGTH;
    if (!(sigmas >= 0) || !(goal->dt > 0) || !(e->lasts > 0)) return ROLN_E_RANGE;
    memset(&w->o, 0, sizeof w->o);
    for (k = 0; k < ROLN_(steps); k++, to += count) {
        roln_status st = ROLN_(doubt)(p, e, plan->s + k, &w->d, &w->u.doubt);
        for (i = 0; !term && i < motors; i++)
            to[i] = sigmas * ROLNI_(tighten_of)(plan->K + (k * motors + i) * n2, w);
        rolni_copy(n2, ROLNI_(numbers)(plan->s + k), w->s), by.u = plan->u + k * motors;
        if (st == ROLN_OK) st = ROLNI_(linear_motors)(p, &by, w->s, w->A, w->B, &w->u.linear);
        if (st != ROLN_OK) return st;
        ROLNI_(tighten_step)(plan, k, goal->dt, e->lasts, w);
        if (joints) st = ROLNI_(pose)(p, ROLNI_(numbers)(plan->s + k + 1), w->u.goal.gx, w->u.goal.J, &w->u.goal.u.pose);
        if (st != ROLN_OK) return st;
        for (i = 0; term && i < count; i++) {
            rolni_zero(n2, w->row);
            rolni_copy(n, ROLNI_(goal_row)(term, i, &w->u.goal), w->row + fast * n);
            to[i] = sigmas * ROLNI_(tighten_of)(w->row, w);
        }
        if (!roln_all_finite(count, to)) return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}
#endif

/* ---- 14 errors of a model -------------------------------------------------------------------- */

/* scratch of NAME_errors: states s [2][block][n], data x [2][block][N], force */
typedef struct {
    roln_real s[2 * ROLN_BLOCK * ROLN_(n)], x[2 * ROLN_BLOCK * ROLN_(N)];
    roln_real held[ROLN_BLOCK * ROLN_(force_size) + ROLNI_TAU(ROLN_, ROLN_BLOCK)]; /* of inputs, u and B u */
    union {
        roln_real encode[ROLNI_ROOM(ROLN_AE_ENCODE_TAPE(ROLN_, 2, ROLN_BLOCK))];
        struct {
            roln_real Y[2 * ROLN_BLOCK * ROLN_(N)], tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, ROLN_BLOCK))];
        } decode;
        struct {
            roln_real decoder[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1 + ROLN_(servo), ROLN_BLOCK))];
            roln_real reduce[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, ROLN_BLOCK))];
            roln_real tape[ROLN_(once_tape)], work[ROLN_(advance)];
        } step;
    } u;
} ROLN_(errors_work);

/* Nonzero if a force acts over the windows of b: an input of actuators that is not given is 0. */
ROLN_FN int ROLNI_(acts)(const roln_batch *b)
{
    return b->tau != NULL || ROLN_(actuator) > 0;
}

/* The inputs of now windows from window `from` that are held from step k to k + 1, the mean over its samples, in units of the
   networks, to held. Nothing is written if no force acts. */
ROLN_FN void ROLNI_(gather_held)(const ROLN_(params) *p, const roln_batch *b, int from, int now, int k, roln_real *held)
{
    const int size = ROLN_(force_size);
    if (!b->tau && ROLN_(actuator) > 0) rolni_zero(now * size, held);
    if (!b->tau) return;
    rolni_gather_tau(b, size, from, now, k, ROLNI_(input_unit)(p), held);
    ROLNI_(own_inputs)(p, now, held);
}

/* Decodes nb states s and adds their errors against the data x [2][nb][N], scaled, to those of one horizon, e: all, joints [N],
   windows [nb]. */
ROLN_FN void ROLNI_(errors_decode)(const ROLN_(params) *p, int nb, const roln_real *qbar, const roln_errors *e,
                                   ROLN_(errors_work) *w)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int N = ROLN_(N);
    const roln_real q = p->scale.q, u = q / p->scale.t, *const each = ROLNI_EACH(p), *const Y = w->u.decode.Y, *const x = w->x;
    int i;
    roln_ae_decode(&ROLN_(model).ae, 2, nb, p->theta, w->s, w->u.decode.Y, w->u.decode.tape);
    for (i = 0; i < nb * N; i++) {
        const roln_real d = q * (Y[i] - roln_lnn_near(lnn, i % N, Y[i], x[i])), at = q * x[i];
        const roln_real unit = each ? each[i % N] : 1, mid = each ? qbar[i % N] / unit : qbar[i % N];
        const roln_real c = at - roln_lnn_near(lnn, i % N, at, mid), v = u * x[nb * N + i], dv = u * Y[nb * N + i] - v;
        rolni_error_add(d, c, dv, v, e->all);
        if (e->joints) rolni_error_add(d * unit, c * unit, dv * unit, v * unit, e->joints + i % N);
        if (e->windows) rolni_error_add(d, c, dv, v, e->windows + i / N);
    }
}

/* Roll-out errors: encode the first sample of every window, step to its end, compare at the horizons of 0 (reconstruction), every,
   2 every .. steps; e points to what is written. Windows of any length; qbar [N] mean of the training q. Steps are those of
   NAME_step, with ROLN_STICTION, too, while the losses of training have the smooth law of friction. A status other than ROLN_OK:
   bad data, or a roll-out left the domain; they are then partial. Status of roln_lnn_step, ROLN_E_NOT_FINITE; ROLN_E_LENGTH: no
   qd, every below 1, or a count as in NAME_grad; they are then untouched. */
ROLN_FN roln_status ROLN_(errors)(const ROLN_(params) *p, const roln_batch *b, roln_real dt, int every,
                                  const roln_real qbar[ROLN_AT_LEAST(ROLN_(N))], const roln_errors *e, ROLN_(errors_work) *w)
{
    const roln_scale *sc = &p->scale;
    const int N = ROLN_(N), size = ROLN_(force_size), nb = ROLN_BLOCK;
    ROLNI_(forced) d;
    size_t rows;
    int from, now, k;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!b->qd || every < 1 || !rolni_batch_valid(b)) return ROLN_E_LENGTH;
    rows = ROLNI_AS(size_t, b->steps / every) + 1;
    memset(e->all, 0, rows * sizeof *e->all);
    if (e->joints) memset(e->joints, 0, rows * ROLNI_AS(size_t, N) * sizeof *e->joints);
    if (e->windows) memset(e->windows, 0, rows * ROLNI_AS(size_t, b->count) * sizeof *e->windows);
    ROLNI_(hold_force)(p, ROLNI_(acts)(b) ? w->held : NULL, w->held + nb * size, w->u.step.decoder, w->u.step.reduce, &d);
    for (from = 0; from < b->count; from += now) {
        now = b->count - from < nb ? b->count - from : nb;
        for (k = 0; k <= b->steps; k++) {
            const size_t row = ROLNI_AS(size_t, k / every), at = row * ROLNI_AS(size_t, b->count) + ROLNI_AS(size_t, from);
            const roln_errors here = {e->all + row, e->joints ? e->joints + row * ROLNI_AS(size_t, N) : NULL,
                                      e->windows ? e->windows + at : NULL};
            roln_status st = ROLN_OK;
            if (k > 0) {
                ROLNI_(gather_held)(p, b, from, now, k - 1, w->held);
                st = ROLNI_(advance)(&d.sys, now, dt / sc->t, w->s, w->u.step.tape, w->u.step.work);
                if (st != ROLN_OK) return st;
                rolni_turn_back(&ROLN_(model).lnn, now, w->s);
            }
            if (k % every != 0) continue;
            rolni_gather(b, b->q, N, from, now, k, 1 / sc->q, w->x);
            rolni_gather(b, b->qd, N, from, now, k, rolni_velocity_unit(sc), w->x + now * N);
            rolni_divide_each(2 * now, N, ROLNI_EACH(p), w->x);
            rolni_turn_back(&ROLN_(model).lnn, now, w->x);
            if (k == 0) roln_ae_encode(&ROLN_(model).ae, 2, now, p->theta, w->x, w->s, w->u.encode);
            ROLNI_(errors_decode)(p, now, qbar, &here, w);
        }
    }
    if (!rolni_errors_finite(rows, e->all)) return ROLN_E_NOT_FINITE;
    return e->joints && !rolni_errors_finite(rows * ROLNI_AS(size_t, N), e->joints) ? ROLN_E_NOT_FINITE : ROLN_OK;
}

/* ---- 15 range, limits and noise from recordings ---------------------------------------------- */

/* Low and high z, largest |zd| [n] over the first samples of the windows of b; of an angle the turn next to the middle of what was
   there before. Status of NAME_encode; then they are scratch. */
ROLN_FN roln_status ROLNI_(range)(const ROLN_(params) *p, const roln_batch *b, roln_real *low, roln_real *high, roln_real *top,
                                  ROLN_(encode_work) *w)
{
    const int n = ROLN_(n);
    int k, i;
    for (k = 0; k < b->count; k++) {
        const size_t row = rolni_sample(b, k, 0) * ROLNI_AS(size_t, ROLN_(N));
        const roln_real *const s = w->s;
        const roln_status st = ROLNI_(encode)(p, b->q + row, b->qd + row, NULL, w->s, w->tape);
        if (st != ROLN_OK) return st;
        for (i = 0; i < n; i++) {
            const roln_real v = ROLN_ABS(s[n + i]);
            const roln_real z = k == 0 ? s[i] : roln_lnn_near(&ROLN_(model).lnn, i, low[i] / 2 + high[i] / 2, s[i]);
            low[i] = k == 0 || z < low[i] ? z : low[i];
            high[i] = k == 0 || z > high[i] ? z : high[i];
            top[i] = k == 0 || v > top[i] ? v : top[i];
        }
    }
    return ROLN_OK;
}

/* scratch of NAME_fit_range */
typedef struct {
    roln_real low[ROLN_(n)], high[ROLN_(n)], top[ROLN_(n)];
    ROLN_(encode_work) encode;
} ROLN_(fit_range_work);

/* Records in p the range seen in training: z_min, z_max, zd_max (largest |zd|) over the samples q, qd [count][N]; of an angle that
   went round, to within a twentieth, it is -pi .. pi, else an arc whose middle lies there. ROLN_E_LENGTH: count below 1; status of
   NAME_encode. p stays as it was unless ROLN_OK. */
ROLN_FN roln_status ROLN_(fit_range)(ROLN_(params) *p, int count, const roln_real *q, const roln_real *qd, ROLN_(fit_range_work) *w)
{
    const int n = ROLN_(n);
    const roln_batch b = {count, 0, 1, NULL, q, qd, NULL, NULL};
    roln_status st;
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (count < 1) return ROLN_E_LENGTH;
    if ((st = ROLNI_(range)(p, &b, w->low, w->high, w->top, &w->encode)) != ROLN_OK) return st;
    for (i = 0; i < n; i++) {
        const roln_real middle = w->low[i] / 2 + w->high[i] / 2, turns = middle - roln_lnn_near(&ROLN_(model).lnn, i, 0, middle);
        w->low[i] -= turns, w->high[i] -= turns;
        if (roln_lnn_angle(&ROLN_(model).lnn, i) && !(w->high[i] - w->low[i] < ROLN_C(1.9) * ROLNI_PI))
            w->low[i] = -ROLNI_PI, w->high[i] = ROLNI_PI;
    }
    rolni_copy(n, w->low, p->z_min);
    rolni_copy(n, w->high, p->z_max);
    rolni_copy(n, w->top, p->zd_max);
    return ROLN_OK;
}

/* Raises `most` to the limits that one sample of good motion needs: range, novelty, distance from the manifold. ROLN_E_RANGE: the
   sample is outside of a range that has no width. ROLN_E_NOT_FINITE: its novelty is no number. t [NAME_terms]: scratch. */
ROLN_FN roln_status ROLNI_(fit_seen)(const ROLN_(params) *p, const ROLN_(state) *at, const ROLN_(latent) *s,
                                     const ROLN_(state) *decoded, roln_limits *most, roln_real *t)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const roln_real novelty = most->evidence ? ROLNI_(novelty)(p, most->evidence, s->z, s->zd, t) : 0;
    int i;
    if (!roln_finite(novelty)) return ROLN_E_NOT_FINITE;
    most->novelty = ROLN_MAX(most->novelty, novelty);
    for (i = 0; i < ROLN_(n); i++) {
        const roln_real wide = p->z_max[i] - p->z_min[i], x = ROLNI_(turned)(p, i, s->z[i]);
        const roln_real out = ROLN_MAX(p->z_min[i] - x, x - p->z_max[i]);
        const roln_real fast = ROLN_ABS(s->zd[i]) - p->zd_max[i];
        if ((out > 0 && !(wide > 0)) || (fast > 0 && !(p->zd_max[i] > 0))) return ROLN_E_RANGE;
        if (out > 0) most->margin = ROLN_MAX(most->margin, out / wide);
        if (fast > 0) most->margin = ROLN_MAX(most->margin, fast / p->zd_max[i]);
    }
    for (i = 0; i < ROLN_(N); i++) {
        const roln_real q = ROLN_ABS(at->q[i] - roln_lnn_near(lnn, i, at->q[i], decoded->q[i]));
        const roln_real qd = ROLN_ABS(at->qd[i] - decoded->qd[i]);
        most->q_tolerance = ROLN_MAX(most->q_tolerance, q), most->qd_tolerance = ROLN_MAX(most->qd_tolerance, qd);
    }
    return ROLN_OK;
}

#define ROLNI_TAIL 128 /* parts of an interval of residuals */

/* scratch of NAME_fit_limits: a sample, its latent state, decoded; a guard; of each joint the largest torque and change; how many
   residuals of windows are in each part of an interval */
typedef struct {
    ROLN_(state) at, decoded;
    ROLN_(latent) s;
    ROLN_(guard) guard;
    roln_real top[ROLN_(force_size)], rise[ROLN_(force_size)];
    uint32_t parts[ROLNI_TAIL];
    union {
        ROLN_(encode_work) encode;
        ROLN_(decode_work) decode;
        ROLN_(guard_tick_work) guard_tick;
        roln_real t[ROLN_(terms)]; /* of novelty */
    } u;
} ROLN_(fit_limits_work);

/* Sample h of recording k to `most` (ROLNI_(fit_seen)), unless that is NULL, and to a guard without limits. */
ROLN_FN roln_status ROLNI_(fit_tick)(const ROLN_(params) *p, const roln_batch *b, const roln_limits *open, int k, int h,
                                     roln_limits *most, ROLN_(fit_limits_work) *w)
{
    const size_t N = ROLN_(N), size = ROLN_(force_size), at = rolni_sample(b, k, h);
    const roln_real *const tau = b->tau ? b->tau + at * size : NULL;
    roln_status st;
    if (h == 0) memset(&w->guard, 0, sizeof w->guard);
    rolni_copy(ROLN_(N), b->q + at * N, w->at.q);
    rolni_copy(ROLN_(N), b->qd + at * N, w->at.qd);
    st = ROLN_(encode)(p, &w->at, &w->s, &w->u.encode);
    if (st == ROLN_OK && most) st = ROLN_(decode)(p, &w->s, &w->decoded, &w->u.decode);
    if (st == ROLN_OK && most) st = ROLNI_(fit_seen)(p, &w->at, &w->s, &w->decoded, most, w->u.t);
    if (st != ROLN_OK) return st;
#if ROLN_DELAY > 0
    if (tau) rolni_copy(ROLN_(force_size), tau, ROLNI_COMING(&w->guard, 0)); /* it acts now */
#endif
    if (ROLN_(guard_tick)(p, open, &w->at, &w->s, tau ? tau : ROLNI_ACTING(&w->guard), &w->guard, &w->u.guard_tick))
        return ROLN_E_NOT_FINITE;
    return ROLN_OK;
}

/* *residual, the largest of all windows of b, becomes the one that `rank` windows are at or beyond, rounded up by at most 2^-14 of
   the largest. */
ROLN_FN void ROLNI_(fit_tail)(const ROLN_(params) *p, const roln_batch *b, const roln_limits *open, uint32_t rank,
                              roln_real *residual, ROLN_(fit_limits_work) *w)
{
    roln_real low = 0, wide = *residual;
    int pass, k, h, part;
    for (pass = 0; pass < 2; pass++) {
        uint32_t above = 0;
        memset(w->parts, 0, sizeof w->parts);
        for (k = 0; k < b->count; k++)
            for (h = 0; h <= b->steps; h++) {
                roln_real x;
                (void)ROLNI_(fit_tick)(p, b, open, k, h, NULL, w); /* ROLN_OK, as in the pass that found *residual */
                x = (ROLN_ABS(w->guard.g.residual) - low) / wide * ROLNI_TAIL;
                if (h == 0 || w->guard.g.ticks > 0 || !(x >= 0)) continue;
                if (x < ROLNI_TAIL) w->parts[ROLNI_AS(int, x)]++;
                else above++;
            }
        for (part = ROLNI_TAIL - 1; part > 0 && above + w->parts[part] < rank; part--)
            above += w->parts[part];
        wide /= ROLNI_TAIL, low += ROLNI_AS(roln_real, part) * wide;
    }
    low = (low + wide) * (1 + 4 * ROLN_EPS);
    *residual = ROLN_MIN(*residual, low);
}

/* Limits from recordings of good motion, the ticks of a controller: window w of b is a recording of b->steps + 1 samples l->dt
   seconds apart, b->stride = 1; b->tau [samples][force_size] the torque from each sample on (NULL: none acted). l->dt, hold,
   residual_window, strict, safe and evidence are yours and stay; false_alarms, too, but it becomes 0 where the residual is.
   margin, residual, q_tolerance, qd_tolerance and, with evidence, novelty become slack times what these recordings need at least,
   margin no less than 0.1; the others are 0, not checked, where nothing was needed. With ROLN_DRIVEN the residual is 0. With
   false_alarms = a the residual is no such multiple: of W windows of residual_window ticks the a (W + 1) with the largest are at it
   or beyond (split conformal prediction; rolni_tail_rank). With b->tau, tau_each and rate_each
   [force_size] become slack times the largest torque of each joint and its largest change, l points to them, and l->tau, l->rate
   are the largest of all. Without b->tau, or where l->motors has a B, they stay. ROLN_E_LENGTH: less than two samples, with
   false_alarms fewer than 1 / false_alarms - 1 windows, or stride is not 1. ROLN_E_RANGE: slack is not 1 or more, dt not positive,
   residual_window negative, false_alarms not below 1, or not 0 with ROLN_DRIVEN, a number that stays is negative or not finite,
   l->tau 0 where it has to be yours, a joint's torque that is not 0 and never changes, of which there would be no limit of rate, or
   the model holds no range (NAME_fit_range). ROLN_E_NOT_FINITE, status of NAME_encode. Then nothing is written. */
ROLN_FN roln_status ROLN_(fit_limits)(const ROLN_(params) *p, const roln_batch *b, roln_real slack, roln_limits *l,
                                      roln_real tau_each[ROLN_AT_LEAST(ROLN_(force_size))],
                                      roln_real rate_each[ROLN_AT_LEAST(ROLN_(force_size))], ROLN_(fit_limits_work) *w)
{
    const size_t size = ROLN_(force_size);
    const int force_size = ROLN_(force_size), torques = b->tau && (!l->motors || !l->motors->B);
    const roln_real none = ROLN_C(1e30), residual = ROLN_(driven) > 0 ? 0 : none;
    roln_limits open = {l->dt, none, residual, none, 0,    0,    0,    l->residual_window, 0,
                        0,     NULL, NULL,     NULL, NULL, NULL, 0,    l->false_alarms},
                most = *l;
    roln_real *const top = w->top, *const rise = w->rise;
    uint32_t windows = 0, rank;
    int k, h, i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || b->steps < 1 || b->stride != 1 || !b->qd) return ROLN_E_LENGTH;
    if (!(slack >= 1) || !rolni_limits_valid(&open, 0) || (!torques && !l->tau_each && !(l->tau > 0))) return ROLN_E_RANGE;
    if (!ROLNI_(has_range)(p)) return ROLN_E_RANGE;
    most.margin = most.residual = most.q_tolerance = most.qd_tolerance = most.novelty = 0;
    rolni_zero(force_size, top);
    rolni_zero(force_size, rise);
    for (k = 0; k < b->count; k++)
        for (h = 0; h <= b->steps; h++) {
            const roln_real *const tau = torques ? b->tau + rolni_sample(b, k, h) * size : NULL;
            const roln_status st = ROLNI_(fit_tick)(p, b, &open, k, h, &most, w);
            if (st != ROLN_OK) return st;
            for (i = 0; i < force_size && tau; i++) {
                top[i] = ROLN_MAX(top[i], ROLN_ABS(tau[i]));
                if (h > 0) rise[i] = ROLN_MAX(rise[i], ROLN_ABS(tau[i] - *(tau - size + i)) / l->dt);
            }
            most.residual = ROLN_MAX(most.residual, ROLN_ABS(w->guard.g.residual));
            windows += h > 0 && w->guard.g.ticks == 0;
        }
    rank = rolni_tail_rank(l->false_alarms, windows);
    if (l->false_alarms > 0 && rank == 0) return ROLN_E_LENGTH;
    if (rank > 0) ROLNI_(fit_tail)(p, b, &open, ROLN_MIN(rank, windows), &most.residual, w);
    else most.residual *= slack;
    if (!(most.residual > 0)) most.false_alarms = 0;
    most.margin = ROLN_MAX(slack * most.margin, most.margin + 4 * ROLN_EPS * (1 + most.margin)); /* the guard rounds otherwise */
    most.margin = ROLN_MAX(most.margin, ROLN_C(0.1));
    most.q_tolerance *= slack, most.qd_tolerance *= slack, most.novelty *= slack;
    if (torques) most.tau = most.rate = 0, most.tau_each = tau_each, most.rate_each = rate_each;
    for (i = 0; i < force_size && torques; i++) {
        if (top[i] > 0 && !(rise[i] > 0)) return ROLN_E_RANGE;
        rise[i] += 4 * ROLN_EPS * top[i] / l->dt; /* what rounds when torques are clipped */
        top[i] *= slack, rise[i] *= slack;
        most.tau = ROLN_MAX(most.tau, top[i]), most.rate = ROLN_MAX(most.rate, rise[i]);
    }
    {
        const roln_real made[7] = {most.margin,  most.residual, most.q_tolerance, most.qd_tolerance,
                                   most.novelty, most.tau,      most.rate};
        roln_limits check = most;
        if (torques) check.tau_each = top, check.rate_each = rise;
        if (!roln_all_finite(torques ? 7 : 5, made)) return ROLN_E_NOT_FINITE;
        if (!rolni_limits_valid(&check, torques ? force_size : 0)) return ROLN_E_RANGE;
    }
    if (torques) rolni_copy(force_size, top, tau_each), rolni_copy(force_size, rise, rate_each);
    *l = most;
    return ROLN_OK;
}

#define ROLNI_HALVINGS 60 /* of noise.tau */

/* scratch of NAME_fit_noise */
typedef struct {
    roln_real each[ROLN_(N)], left[ROLN_(N)], rest[ROLN_(N)], before[ROLN_(N)]; /* of the chart: sums, what they lose, the last r */
    roln_real torque[ROLN_(N)];                                                 /* deviations of torques that are tried */
    union {
        ROLN_(filter_tick_work) filter;
        struct {
            roln_real s[2 * ROLN_(n)], scratch[2 * ROLN_(n)], still[ROLN_(N)], x[2 * ROLN_(N)];
            union {
                roln_real encode[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)];
                roln_real decode[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 1))];
            } u;
        } chart;
    } u;
} ROLN_(fit_noise_work);

/* Log likelihood of the recordings in b under noise, to *sum; NaN in q: not measured. */
ROLN_FN roln_status ROLNI_(noise_likelihood)(const ROLN_(params) *p, const roln_noise *noise, const roln_batch *b, double *sum,
                                             ROLN_(filter_tick_work) *w)
{
    const int n2 = 2 * ROLN_(n);
    roln_real last[ROLN_(n)], *const zdd = ROLN_(leaps) ? last : NULL;
    rolni_innovation in;
    int k, h, i;
    *sum = 0;
    for (k = 0; k < b->count; k++)
        for (h = 0; h <= b->steps; h++) {
            const size_t at = rolni_sample(b, k, h);
            const roln_real *const y = b->q + at * ROLNI_AS(size_t, ROLN_(N));
            if (h == 0) {
                if (ROLNI_(filter_start)(p, noise, y, NULL, 0, &in, zdd, w) != ROLN_FILTER_START) return ROLN_E_NOT_FINITE;
            } else {
                const roln_real *const tau = b->tau ? b->tau + (at - 1) * ROLNI_AS(size_t, ROLN_(force_size)) : NULL;
                roln_status st = ROLNI_(filter_predict)(p, noise, tau, 0, zdd, w);
                if (st == ROLN_OK) st = ROLNI_(filter_correct)(noise, 0, y, 0, &in, w);
                if (st != ROLN_OK) return st;
            }
            if (in.used == 0) continue;
            *sum -= ROLNI_AS(double, in.nis) / 2;
            for (i = 0; i < n2; i++)
                *sum -= ROLNI_AS(double, roln_log(ROLN_ABS(w->A[i * (n2 + 1)])));
        }
    return ROLN_OK;
}

/* Adds to w->each [N] what the chart leaves of each joint: each^2 += mean of r_k r_k+1, r = q - phi(rho(q)), over neighbours k and
   k + 1. White noise is in r, too, but drops out of this mean, which is that of r^2 if motion is slow beside dt. Samples that are
   not complete do not count. */
ROLN_FN void ROLNI_(noise_of_chart)(const ROLN_(params) *p, const roln_batch *b, ROLN_(fit_noise_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n);
    roln_real *const s = w->u.chart.s, *const x = w->u.chart.x, *const still = w->u.chart.still;
    double count = 0;
    int k, h, i;
    rolni_zero(N, w->left);
    rolni_zero(N, w->rest);
    rolni_zero(N, still);
    for (k = 0; k < b->count; k++) {
        int known = 0;
        for (h = 0; h <= b->steps; h++) {
            const roln_real *const y = b->q + rolni_sample(b, k, h) * ROLNI_AS(size_t, N);
            const int last = known;
            known = ROLNI_(encode)(p, y, still, NULL, s, w->u.chart.u.encode) == ROLN_OK;
            if (known) known = ROLNI_(decode)(p, s, s + n, x, w->u.chart.u.decode, w->u.chart.scratch) == ROLN_OK;
            for (i = 0; i < N && known; i++) {
                const roln_real r = y[i] - roln_lnn_near(&ROLN_(model).lnn, i, y[i], x[i]);
                if (last) w->rest[i] += r * w->before[i];
                w->before[i] = r;
            }
            if (!known || !last) continue;
            rolni_fold(N, w->left, w->rest);
            count += 1;
        }
    }
    for (i = 0; i < N; i++)
        if (w->left[i] > 0) w->each[i] = ROLN_SQRT(w->each[i] * w->each[i] + w->left[i] / ROLNI_AS(roln_real, count));
}

/* Noise of NAME_filter_tick from recordings: window w of b is one of b->steps + 1 ticks l->dt seconds apart, b->stride = 1, of
   positions b->q as the encoders give them, not smoothed, and of the torques b->tau, NULL: none acted; b->qd is not read. The first
   sample is complete, later ones may be NaN. l->dt, gate, lost are yours and stay. l->q above 0, or l->q_each, stay, and have to
   count for both, the noise of a joint and what the chart leaves of it; with l->q = 0 q_each [N] becomes the root of the sum of
   their squares, noise^2 + mean (q - phi(rho(q)))^2 (at least 5 ticks), and l->q_each points to it (held by test_noise.c:
   test_fit_chart); else q_each may be NULL. Candidates for l->tau are the torque that gives the
   largest velocity of training in one tick, and its halves, quarters, ..; l->tau becomes four times the largest candidate whose
   likelihood is within e^2 of the best (four times: the error of a model lasts, white noise does not, and F^T F is to hold it), and
   l->tau_each NULL. Joints of different size: tau_each [N] has how their unknown torques compare, such as what the model leaves of
   each torque; it is multiplied by l->tau of that, and l->tau_each points to it. tau_each NULL: all joints have the same.
   l->load is yours, too; nothing but the machine that was trained moved.
   ROLN_E_LENGTH: no window, less than 2 ticks, or stride is not 1; ROLN_E_RANGE: l makes no sense, a joint has no noise, q_each
   is NULL where it is needed, a number of tau_each is below 0, or the model holds no range; ROLN_E_NOT_FINITE, also if all of
   tau_each are 0, status of NAME_linear. l, q_each and tau_each stay as they were unless ROLN_OK. Cost: 8 to 60 times
   NAME_filter_tick for every tick. */
ROLN_FN roln_status ROLN_(fit_noise)(const ROLN_(params) *p, const roln_batch *b, roln_noise *l, roln_real q_each[ROLN_(N)],
                                     roln_real tau_each[ROLN_(N)], ROLN_(fit_noise_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), estimate = l->q >= 0 && l->q <= 0 && !l->q_each;
    ROLN_(filter_tick_work) *const f = &w->u.filter;
    roln_noise noise = *l;
    rolni_innovation in;
    const double none = -1e300;
    double sum[ROLNI_HALVINGS];
    roln_real top = 0;
    roln_status st = ROLN_OK;
    int i, k, best = 0, worse = 0;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || b->stride != 1 || b->steps < (estimate ? 4 : 1)) return ROLN_E_LENGTH;
    noise.tau = 1, noise.tau_each = tau_each;
    if (estimate && !q_each) return ROLN_E_RANGE;
    if (estimate) {
        rolni_noise_of_joints(&ROLN_(model), b, w->each);
        ROLNI_(noise_of_chart)(p, b, w);
        noise.q_each = w->each;
    }
    if (!rolni_noise_valid(N, &noise)) return ROLN_E_RANGE;
    switch (ROLNI_(filter_start)(p, &noise, b->q + rolni_sample(b, 0, 0) * ROLNI_AS(size_t, N), NULL, 0, &in, NULL, f)) {
    case ROLN_FILTER_START: st = ROLNI_(filter_unknown)(p, &noise, 0, f->rows, f); break;
    case ROLN_FAULT_RANGE | ROLN_FILTER_NONE: return ROLN_E_RANGE;
    default: return ROLN_E_NOT_FINITE;
    }
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) { /* |row i of M^-1 J^T| dt */
        roln_real square = 0;
        for (k = 0; k < n; k++)
            square += f->rows[k * 2 * n + n + i] * f->rows[k * 2 * n + n + i];
        if (square > 0) top = ROLN_MAX(top, p->zd_max[i] / ROLN_SQRT(square));
    }
    if (!(top > 0)) return ROLN_E_NOT_FINITE;
    for (k = 0, noise.tau = top; k < ROLNI_HALVINGS && worse < 6; k++, noise.tau /= 2) {
        roln_status got;
        for (i = 0; tau_each && i < N; i++)
            w->torque[i] = tau_each[i] * noise.tau;
        if (tau_each) noise.tau_each = w->torque;
        got = ROLNI_(noise_likelihood)(p, &noise, b, sum + k, f);
        if (got != ROLN_OK) st = got, sum[k] = none;
        else if (sum[k] > sum[best]) best = k, worse = 0;
        else worse++;
    }
    if (!(sum[best] > none)) return st;
    for (k = 0; sum[k] < sum[best] - 2; k++)
        top /= 2;
    if (estimate) rolni_copy(N, w->each, q_each), l->q_each = q_each;
    l->tau = 4 * top, l->tau_each = tau_each;
    for (i = 0; tau_each && i < N; i++)
        tau_each[i] *= l->tau;
    return ROLN_OK;
}

/* scratch of NAME_fit_observer: a state, centres and the samples near each; at a centre the step A, the triangle D of unknown
   torques, the measurement H, the Riccati equation's C and K */
typedef struct {
    roln_real s[2 * ROLN_(n)], next[ROLN_(centres)][ROLN_(n)], r[ROLN_(n)];
    int taken[ROLN_(centres)];
    roln_real A[4 * ROLN_(n) * ROLN_(n)], D[4 * ROLN_(n) * ROLN_(n)], H[2 * ROLN_(n) * ROLN_(n)];
    roln_real C[4 * ROLN_(n) * ROLN_(n)], K[2 * ROLN_(n) * ROLN_(n)], J[ROLN_(N) * ROLN_(n)], T[ROLN_(N) * ROLN_(n)];
    roln_real torque[ROLN_(N)];
    ROLN_(observer_gains) found;
    union {
        roln_real encode[ROLN_AE_ENCODE_REST(ROLN_, 2, 1) + 2 * ROLN_(N)];
        ROLN_(filter_tick_work) filter;
        roln_real triangle[ROLN_QR_R_WORK(ROLN_(N), ROLN_(n))];
        roln_real dare[ROLN_DARE_WORK(2 * ROLN_(n), ROLN_(n))];
    } u;
} ROLN_(fit_observer_work);

/* Eight states among those of b, each the mean of the samples that are nearest to it: begun at the samples that are farthest from
   those before, then eight rounds. */
ROLN_FN roln_status ROLNI_(observer_centres)(const ROLN_(params) *p, const roln_batch *b, ROLN_(fit_observer_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), centres = ROLN_(centres), rounds = centres + 8;
    int round, k, h, c, i;
    for (round = 0; round < rounds; round++) {
        const int chosen = round < centres ? round : centres;
        roln_real most = -1;
        for (c = 0; c < centres; c++)
            w->taken[c] = 0;
        for (k = 0; k < b->count; k++)
            for (h = 0; h <= b->steps; h++) {
                const roln_real *const y = b->q + rolni_sample(b, k, h) * ROLNI_AS(size_t, N);
                roln_real least = 0;
                int at = 0;
                rolni_zero(N, w->T);
                if (ROLNI_(encode)(p, y, w->T, NULL, w->s, w->u.encode) != ROLN_OK) continue;
                for (c = 0; c < chosen; c++) {
                    const roln_real d = ROLNI_(distance)(p, w->s, w->found.z[c]);
                    if (c == 0 || d < least) least = d, at = c;
                }
                if (round < centres) {
                    if (most < 0 || (chosen > 0 && least > most)) most = least, rolni_copy(n, w->s, w->next[round]);
                    continue;
                }
                if (w->taken[at]++ == 0) rolni_copy(n, w->s, w->next[at]);
                else for (i = 0; i < n; i++) {
                    const roln_real z = roln_lnn_near(&ROLN_(model).lnn, i, w->next[at][i], w->s[i]);
                    w->next[at][i] += (z - w->next[at][i]) / ROLNI_AS(roln_real, w->taken[at]);
                }
            }
        if (round < centres && most < 0) return ROLN_E_NOT_FINITE;
        for (c = 0; c < centres; c++)
            if (round < centres ? c == round : w->taken[c] > 0) rolni_copy(n, w->next[c], w->found.z[c]);
    }
    return ROLN_OK;
}

/* The prediction and the measurement of a filter that rests at z: A^T; D, D^T D the covariance of unknown torques; J; and
   H = [T 0]^T with T^T T = J^T R^-1 J. */
ROLN_FN roln_status ROLNI_(observer_at)(const ROLN_(params) *p, const roln_noise *noise, const roln_real *z,
                                        ROLN_(fit_observer_work) *w)
{
    enum { N = ROLN_(N), n = ROLN_(n), n2 = 2 * n };
    ROLN_(filter_tick_work) *const f = &w->u.filter;
    rolni_push by;
    rolni_slopes to;
    roln_status st;
    int i, j;
    by.tau = by.load = NULL, by.dt = noise->dt, by.how = ROLNI_LOOK | ROLNI_SLIDE;
    to.A = w->A, to.B = to.L = NULL;
    rolni_copy(n, z, f->s);
    rolni_zero(n, f->s + n);
    ROLNI_(beyond_friction)(p, f->s);
    st = ROLNI_(linear)(p, f->s, f->s + n, &by, &to, &f->u.linear.base, f->u.linear.J, f->u.linear.work);
    rolni_copy(n, z, f->s);
    rolni_zero(n, f->s + n);
    if (st == ROLN_OK) st = ROLNI_(pose)(p, f->s, f->q, f->J, &f->u.pose);
    rolni_zero(n2 * n2, w->D);
    if (st == ROLN_OK) st = ROLNI_(filter_unknown)(p, noise, 0, f->rows, f);
    if (st != ROLN_OK) return st;
    rolni_copy(n * n2, f->rows, w->D);
    rolni_copy(N * n, f->J, w->J);
    for (i = 0; i < N * n; i++)
        w->T[i] = w->J[i] / w->found.q[i / n];
    for (i = 0; i < n2; i++) /* A^T */
        for (j = 0; j < i; j++) {
            const roln_real a = w->A[i * n2 + j];
            w->A[i * n2 + j] = w->A[j * n2 + i];
            w->A[j * n2 + i] = a;
        }
    roln_qr_r(N, n, w->T, w->u.triangle);
    rolni_zero(n2 * n, w->H);
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            w->H[i * n + j] = j <= i ? w->T[j * n + i] : 0;
    return ROLN_OK;
}

/* P [2n][n] of a filter that has settled at z, at rest, and deviations e [N] of what it expects, the largest so far; NULL: not
   wanted. With H of NAME_i_observer_at and the covariance C^T C in front of a measurement, P = C^T (1 + C H^T H C^T)^-1 C. */
ROLN_FN roln_status ROLNI_(observer_settle)(const ROLN_(params) *p, const roln_noise *noise, const roln_real *z, roln_real *P,
                                            roln_real *e, ROLN_(fit_observer_work) *w)
{
    enum { N = ROLN_(N), n = ROLN_(n), n2 = 2 * n };
    roln_status st = ROLNI_(observer_at)(p, noise, z, w);
    int i, k;
    for (i = 0; i < n; i++)
        w->r[i] = 1;
    if (st == ROLN_OK) st = roln_dare(n2, n, w->A, w->H, w->D, w->r, w->C, w->K, w->u.dare);
    if (st != ROLN_OK) return st;
    for (i = 0; e && i < N; i++) { /* e^2 = q^2 + |C J_i^T|^2 */
        roln_real square = w->found.q[i] * w->found.q[i];
        for (k = 0; k < n2; k++) {
            const roln_real c = roln_dot(n, w->C + k * n2, w->J + i * n);
            square += c * c;
        }
        e[i] = ROLN_MAX(e[i], ROLN_SQRT(square));
    }
    roln_mm(n2, n2, n, w->C, w->H, w->K);
    roln_mm_bt(n2, n, n2, w->K, w->K, w->A);
    for (i = 0; i < n2; i++)
        w->A[i * (n2 + 1)] += 1;
    if ((st = roln_chol(n2, w->A, w->A)) != ROLN_OK) return st;
    for (i = 0; i < n2; i++) { /* D: the columns of L^-1 C as rows */
        for (k = 0; k < n2; k++)
            w->s[k] = w->C[k * n2 + i];
        roln_solve_lower(n2, w->A, w->s, w->D + i * n2);
    }
    roln_mm_bt(n2, n2, n, w->D, w->D, w->K);
    if (!roln_all_finite(n2 * n, w->K)) return ROLN_E_NOT_FINITE;
    rolni_copy(n2 * n, w->K, P);
    return ROLN_OK;
}

/* Gains of NAME_observer_tick for the noise of NAME_fit_noise, which may stay as it is for NAME_filter_tick: what the covariance of
   that filter settles at, at rest, at eight states of the recordings in b, windows of b->steps + 1 samples of positions b->q.
   Samples that are not complete do not count. noise->load is not read: an observer estimates no load.
   ROLN_E_LENGTH: no window, or no stride; ROLN_E_RANGE: noise makes no sense, or the model holds no range; ROLN_E_NOT_FINITE, also
   if no sample is complete; ROLN_E_NO_CONVERGENCE: nothing settles, as where no torque is unknown; status of NAME_linear,
   roln_dare. g stays as it was unless ROLN_OK. Cost: 16 NAME_encode a sample, 8 times NAME_linear and roln_dare of 2n. */
ROLN_FN roln_status ROLN_(fit_observer)(const ROLN_(params) *p, const roln_noise *noise, const roln_batch *b,
                                        ROLN_(observer_gains) *g, ROLN_(fit_observer_work) *w)
{
    ROLN_(observer_gains) *const to = &w->found;
    const roln_real faster = 64;
    roln_noise start = *noise;
    roln_status st;
    int i, c;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || !rolni_batch_valid(b)) return ROLN_E_LENGTH;
    if (!rolni_noise_valid(ROLN_(N), noise)) return ROLN_E_RANGE;
    for (i = 0; i < ROLN_(n); i++)
        if (!(p->z_max[i] > p->z_min[i])) return ROLN_E_RANGE;
    to->dt = noise->dt, to->gate = noise->gate, to->lost = noise->lost;
    for (i = 0; i < ROLN_(N); i++) {
        to->q[i] = noise->q_each ? noise->q_each[i] : noise->q;
        to->e[i] = 0;
    }
    start.tau *= faster;
    for (i = 0; noise->tau_each && i < ROLN_(N); i++)
        w->torque[i] = faster * noise->tau_each[i];
    if (noise->tau_each) start.tau_each = w->torque;
    to->settle = 0;
    st = ROLNI_(observer_centres)(p, b, w);
    for (c = 0; c < ROLN_(centres) && st == ROLN_OK; c++) {
        roln_real z = 0, zd = 0;
        st = ROLNI_(observer_settle)(p, noise, to->z[c], to->P[0][c], to->e, w);
        if (st == ROLN_OK) st = ROLNI_(observer_settle)(p, &start, to->z[c], to->P[1][c], NULL, w);
        for (i = 0; i < ROLN_(n) && st == ROLN_OK; i++) { /* of a bandwidth W the gains are 2^1/2 W and W^2 */
            z += to->P[1][c][i * (ROLN_(n) + 1)];
            zd += to->P[1][c][(ROLN_(n) + i) * ROLN_(n) + i];
        }
        if (st == ROLN_OK) to->settle = ROLN_MAX(to->settle, ROLN_SQRT(ROLN_C(8.0)) * z / (zd * to->dt)); /* 4 / (W dt) */
    }
    if (st != ROLN_OK) return st;
    if (!roln_finite(to->settle) || !roln_all_finite(ROLN_(N), to->e)) return ROLN_E_NOT_FINITE;
    *g = *to;
    return ROLN_OK;
}

/* scratch of NAME_evidence_add */
typedef struct {
    roln_real t[ROLN_(terms)];
    ROLN_(encode_work) encode;
} ROLN_(evidence_add_work);

/* Adds the states of recorded motion to e: every sample of the windows of b, b->q and b->qd. e begins with a state that is large
   in each term (A = 1), so a novelty means something from the first sample on. From 1 / (64 ROLN_EPS) states on (131072 as float)
   the oldest fade, but not that one. ROLN_E_LENGTH: no window, stride or qd; ROLN_E_RANGE: the model has no range (NAME_fit_range),
   or a state lies beyond it, z by half its width, zd by half the largest, as after a slip of an encoder: it would outweigh all
   others; ROLN_E_NOT_FINITE, also of a state whose terms overflow; status of NAME_encode. States before a bad one were added.
   Cost a state with n = 4: NAME_encode and 23,000 multiply-adds. */
ROLN_FN roln_status ROLN_(evidence_add)(const ROLN_(params) *p, const roln_batch *b, ROLN_(evidence) *e,
                                        ROLN_(evidence_add_work) *w)
{
    const size_t N = ROLN_(N);
    const int n = ROLN_(n), terms = ROLN_(terms);
    roln_real *const s = w->encode.s;
    int k, h, i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || !rolni_batch_valid(b) || !b->qd) return ROLN_E_LENGTH;
    for (i = 0; i < n; i++)
        if (!(p->z_max[i] > p->z_min[i]) || !(p->zd_max[i] > 0)) return ROLN_E_RANGE;
    for (k = 0; k < b->count; k++)
        for (h = 0; h <= b->steps; h++) {
            const size_t at = rolni_sample(b, k, h) * N;
            const roln_status st = ROLNI_(encode)(p, b->q + at, b->qd + at, NULL, s, w->encode.tape);
            if (st != ROLN_OK) return st;
            if (!ROLNI_(in_range)(p, ROLN_C(0.5), s, s + n)) return ROLN_E_RANGE;
            ROLNI_(terms_of)(p, s, s + n, w->t);
            if (!roln_all_finite(terms, w->t)) return ROLN_E_NOT_FINITE;
            if (!(e->count > 0)) {
                rolni_zero(ROLN_TRI(terms), e->L);
                for (i = 0; i < terms; i++)
                    e->L[ROLN_TRI(i) + i] = 1;
                e->count = 1;
            }
            if (e->count < ROLNI_AVERAGED) e->count += 1;
            rolni_novelty_add(terms, e->count, e->L, w->t);
        }
    return ROLN_OK;
}

/* scratch of NAME_fit_doubt: sums over windows; logs, errors^2 over the variance */
typedef struct {
    rolni_growths logs, squares[2 * ROLN_(n)];
    ROLN_(state) x;
    ROLN_(latent) s, end;
    ROLN_(equation) equation;
    roln_real tau[ROLN_(force_size)], t[ROLN_(terms)], error[2 * ROLN_(n)];
    union {
        ROLN_(encode_work) encode;
        ROLN_(step_work) step;
        ROLN_(dynamics_work) dynamics;
    } u;
} ROLN_(fit_doubt_work);

/* The latent state s of sample h of window k of b. x: scratch. */
ROLN_FN roln_status ROLNI_(encode_at)(const ROLN_(params) *p, const roln_batch *b, int k, int h, ROLN_(state) *x, ROLN_(latent) *s,
                                      ROLN_(encode_work) *w)
{
    const size_t at = rolni_sample(b, k, h) * ROLN_(N);
    rolni_copy(ROLN_(N), b->q + at, x->q);
    rolni_copy(ROLN_(N), b->qd + at, x->qd);
    return ROLN_(encode)(p, x, s, w);
}

/* Writes the mean error of the model over window k of b to w->error: of zdd, and of the force M zdd. *novelty: that of its
   start. */
ROLN_FN roln_status ROLNI_(missed)(const ROLN_(params) *p, const roln_batch *b, int k, roln_real dt, const roln_real *L,
                                   roln_real *novelty, ROLN_(fit_doubt_work) *w)
{
    const int n = ROLN_(n);
    const roln_real span = dt * ROLNI_AS(roln_real, b->steps);
    roln_status st = ROLNI_(encode_at)(p, b, k, 0, &w->x, &w->s, &w->u.encode);
    int h, i;
    if (st == ROLN_OK) st = ROLNI_(encode_at)(p, b, k, b->steps, &w->x, &w->end, &w->u.encode);
    if (st != ROLN_OK) return st;
    *novelty = ROLNI_(novelty)(p, L, w->s.z, w->s.zd, w->t);
    st = ROLN_(dynamics)(p, &w->s, &w->equation, &w->u.dynamics);
    for (h = 0; h < b->steps && st == ROLN_OK; h++) {
        if (b->tau) rolni_gather_tau(b, ROLN_(force_size), k, 1, h, 1, w->tau);
        st = ROLN_(step)(p, &w->s, b->tau ? w->tau : NULL, dt, &w->u.step);
    }
    for (i = 0; i < n; i++)
        w->error[i] = (w->end.zd[i] - w->s.zd[i]) / span;
    roln_mm(n, n, 1, w->equation.M, w->error, w->error + n);
    for (i = 0; i < 2 * n; i++) { /* their mean square over a small variance is a number, too */
        const roln_real large = w->error[i] * ROLN_C(1e5);
        if (st == ROLN_OK && !roln_finite(large * large)) st = ROLN_E_NOT_FINITE;
    }
    if (st == ROLN_OK && (!(*novelty > 0) || !roln_finite(*novelty))) st = ROLN_E_NOT_FINITE;
    return st;
}

/* Deviations of NAME_doubt, to e, whose states were added before, from recordings that the model was not trained with: the law of
   growth under which the errors of the windows of b are likeliest. An error is the mean over a window of the acceleration that
   NAME_step misses, steps of dt seconds apart, and M times it. Long windows average the noise of qd: 25 ms are usual.
   Deviations from few windows are too small: take a hundred or more. e->lasts becomes 0: call NAME_fit_outlook next.
   ROLN_E_LENGTH: no window, step, stride or qd; ROLN_E_RANGE: e has seen no state; status of NAME_encode, NAME_step, NAME_dynamics;
   ROLN_E_NOT_FINITE, also of errors beyond 1e14 as float. e is untouched unless ROLN_OK. */
ROLN_FN roln_status ROLN_(fit_doubt)(const ROLN_(params) *p, const roln_batch *b, roln_real dt, ROLN_(evidence) *e,
                                     ROLN_(fit_doubt_work) *w)
{
    int k;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || b->steps < 1 || b->stride < 1 || !b->qd) return ROLN_E_LENGTH;
    if (!(e->count > 0) || !(dt > 0)) return ROLN_E_RANGE;
    memset(w->logs, 0, sizeof w->logs);
    memset(w->squares, 0, sizeof w->squares);
    for (k = 0; k < b->count; k++) {
        roln_real novelty;
        const roln_status st = ROLNI_(missed)(p, b, k, dt, e->L, &novelty, w);
        if (st != ROLN_OK) return st;
        rolni_growth_add(2 * ROLN_(n), novelty, w->error, w->logs, w->squares);
    }
    e->halves = rolni_growth_solve(b->count, 2 * ROLN_(n), w->logs, w->squares, e->always, e->grows);
    e->lasts = 0;
    return ROLN_OK;
}

/* scratch of NAME_fit_outlook: minus twice the log likelihood under each time, and covariances of a roll-out */
typedef struct {
    double cost[ROLNI_TIMES];
    ROLN_(outlook) o[ROLNI_TIMES];
    ROLN_(state) x;
    ROLN_(latent) s, seen;
    roln_real tau[ROLN_(force_size)];
    union {
        ROLN_(encode_work) encode;
        ROLN_(doubt_ahead_work) ahead;
    } u;
} ROLN_(fit_outlook_work);

/* Step h of a roll-out of window k of b from w->s, and its covariances w->o under errors that last `lasts`, lasts / 2, .. */
ROLN_FN roln_status ROLNI_(outlook_step)(const ROLN_(params) *p, const ROLN_(evidence) *e, const roln_batch *b, int k, int h,
                                         roln_real dt, roln_real lasts, ROLN_(fit_outlook_work) *w)
{
    ROLN_(doubt_ahead_work) *const a = &w->u.ahead;
    roln_status st;
    int t;
    if (b->tau) rolni_gather_tau(b, ROLN_(force_size), k, 1, h, 1, w->tau);
    st = ROLNI_(doubt_step)(p, e, &w->s, b->tau ? w->tau : NULL, dt, a);
    for (t = 0; t < ROLNI_TIMES && st == ROLN_OK; t++, lasts /= 2) {
        ROLNI_(spread)(a->u.linear.j.A, &a->d, dt, lasts, w->o + t, &a->o, a->g, a->moved);
        w->o[t] = a->o;
    }
    w->s = a->s;
    return st;
}

/* Adds what sample h of window k of b, where w->s should be, costs under each time. */
ROLN_FN roln_status ROLNI_(outlook_look)(const ROLN_(params) *p, const roln_batch *b, int k, int h, ROLN_(fit_outlook_work) *w)
{
    const roln_status st = ROLNI_(encode_at)(p, b, k, h, &w->x, &w->seen, &w->u.encode);
    int t, i;
    for (i = 0; i < ROLN_(n) && st == ROLN_OK; i++) {
        const roln_real off = w->seen.z[i] - roln_lnn_near(&ROLN_(model).lnn, i, w->seen.z[i], w->s.z[i]);
        for (t = 0; t < ROLNI_TIMES; t++) {
            const roln_real variance = w->o[t].P[i * (2 * ROLN_(n) + 1)];
            w->cost[t] += ROLNI_AS(double, off) * ROLNI_AS(double, off) / ROLNI_AS(double, variance);
            w->cost[t] += ROLNI_AS(double, roln_log(variance));
        }
    }
    return st;
}

/* e->lasts, the time over which errors of the acceleration are correlated, from recordings that the model was not trained with: of
   ten times, the length of the windows of b over 1, 2, 4 .. 512, the longest under which z, an eighth, a quarter and half of a
   window after its start and at its end, is at most e^2 times as unlikely as under the likeliest: few windows leave long times, and
   so large deviations. The four are so alike that they count as one. The deviations are those of NAME_fit_doubt before.
   ROLN_E_LENGTH, ROLN_E_RANGE as there; status of NAME_encode, NAME_doubt, NAME_linear; ROLN_E_NOT_FINITE also of deviations that
   are 0. e is untouched unless ROLN_OK. Cost of a step: NAME_linear and 200 n^3 multiply-adds. */
ROLN_FN roln_status ROLN_(fit_outlook)(const ROLN_(params) *p, const roln_batch *b, roln_real dt, ROLN_(evidence) *e,
                                       ROLN_(fit_outlook_work) *w)
{
    const roln_real longest = dt * ROLNI_AS(roln_real, b->steps);
    roln_real part = 1;
    double least;
    int k, h;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (b->count < 1 || b->steps < 1 || b->stride < 1 || !b->qd) return ROLN_E_LENGTH;
    if (!(e->count > 0) || !(dt > 0)) return ROLN_E_RANGE;
    memset(w->cost, 0, sizeof w->cost);
    for (k = 0; k < b->count; k++) {
        roln_status st = ROLNI_(encode_at)(p, b, k, 0, &w->x, &w->s, &w->u.encode);
        memset(w->o, 0, sizeof w->o);
        for (h = 0; h < b->steps && st == ROLN_OK; ) {
            st = ROLNI_(outlook_step)(p, e, b, k, h++, dt, longest, w);
            if (st == ROLN_OK && (h == b->steps || h == b->steps / 2 || h == b->steps / 4 || h == b->steps / 8))
                st = ROLNI_(outlook_look)(p, b, k, h, w);
        }
        if (st != ROLN_OK) return st;
    }
    for (k = 0, least = w->cost[0]; k < ROLNI_TIMES; k++) {
        if (!(w->cost[k] - w->cost[k] >= 0)) return ROLN_E_NOT_FINITE;
        least = ROLN_MIN(least, w->cost[k]);
    }
    for (k = 0; w->cost[k] > least + 4 * 4; k++)
        part /= 2;
    e->lasts = longest * part;
    return ROLN_OK;
}

#if ROLNI_BITS(ROLN_QUANTISE) == 0

/* ---- 16 a training sample -------------------------------------------------------------------- */

/* A sample is encoded (roln_ae_encode), stepped (roln_lnn_step), decoded (roln_ae_decode) and compared with the data. From there it
   goes back through the same stations in reverse, each of which computes its forward once more: NAME_i_samples_forward and
   _backward for the acceleration loss of single samples, NAME_i_windows_forward and _backward for windows of several steps. */

/* Gradient: sums over the windows of all calls since it was zeroed, to be divided by `windows`. Zero it whole before the first
   NAME_grad of an update. Calls add up as if in twice the digits: after a million windows a sum is still right to 200 eps of the
   largest number (held by test_sums.c). An array of numbers: gradients of other machines are added to it number by number. */
typedef struct {
    roln_real theta[ROLN_(theta_size)];
    roln_loss loss; /* unweighted terms; roln_loss_total */
    roln_real windows;
    struct {
        roln_real theta[ROLN_(theta_size)];
        roln_loss loss;
        roln_real windows;
    } rest; /* what these have lost by rounding */
} ROLN_(gradient);

/* Scratch of the force on a block, and of its backward. */
typedef struct {
    roln_real tau[ROLNI_ROOM(ROLNI_TAU(ROLN_, ROLN_BLOCK))];
    union {
        struct {
            roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 1 + ROLN_(servo), ROLN_BLOCK))];
            roln_real work[ROLNI_ROOM(ROLN_AE_REDUCE_WORK(ROLN_, ROLN_BLOCK))];
        } eval;
        struct {
            roln_real g[ROLNI_ROOM(ROLN_MAX(ROLNI_TAU(ROLN_, ROLN_BLOCK), (ROLN_(keeps) > 0) * ROLN_BLOCK * ROLN_(n)))];
            roln_real work[ROLNI_ROOM(ROLN_AE_REDUCE_BWD_WORK(ROLN_, ROLN_BLOCK))];
        } bwd;
    } u;
} ROLNI_(force_block_work);

/* A force `in` on a block, NULL: none, whose gradients go where those of g do. */
ROLN_FN void ROLNI_(hold_force_block)(const ROLN_(params) *p, const roln_real *in, const roln_gradient *g,
                                      ROLNI_(force_block_work) *w, ROLNI_(forced) *d)
{
    ROLNI_(hold_force)(p, in, w->tau, w->u.eval.tape, w->u.eval.work, d);
    d->force.bwd = ROLNI_(torque_bwd);
    d->torque.g = w->u.bwd.g, d->torque.bwd = w->u.bwd.work;
    d->torque.gae = g->ae;
    d->torque.gB = g->net ? g->net + ROLN_(rest_size) - ROLN_(input_size) : NULL;
}

/* scratch of NAME_grad: encoded samples Z [horizon + 1][2][block][n], predicted ones P; cotangents of an encoded sample, of a
   predicted one, and of the one before; data x [2][block][N], force, the encoder's tape; and that of the stations, one after the
   other: a step and its backward, of the model or of the midpoint rule, which the variational loss takes; decoding and comparing */
typedef struct {
    roln_real Z[2 * (ROLN_HORIZON + 1) * ROLN_BLOCK * ROLN_(n)], P[2 * (ROLN_HORIZON + 1) * ROLN_BLOCK * ROLN_(n)];
    roln_real gZ[2 * ROLN_BLOCK * ROLN_(n)], gP[2 * ROLN_BLOCK * ROLN_(n)], gB[2 * ROLN_BLOCK * ROLN_(n)];
    roln_real x[2 * ROLN_BLOCK * ROLN_(N)], held[ROLN_BLOCK * ROLN_(force_size)];
    roln_real tape[ROLNI_ROOM(ROLN_AE_ENCODE_TAPE(ROLN_, 2, ROLN_BLOCK))];
    union {
        struct {
            ROLNI_(force_block_work) force;
            union {
                struct {
                    roln_real tape[ROLN_(once_tape)];
                    roln_real work[ROLN_MAX(ROLN_MAX(ROLN_(step_once), ROLN_(mid_once)), ROLN_(start_once))];
                } once;
                struct {
                    roln_real tapes[ROLN_(step_tapes)], work[ROLN_MAX(ROLN_(step_kept), ROLN_(step_bwd))];
                } kept;
                struct {
                    roln_real tapes[ROLN_(mid_tapes)];
                    roln_real work[ROLN_MAX(ROLN_MAX(ROLN_(mid_kept), ROLN_(mid_bwd)),
                                            ROLN_MAX(ROLN_(start_kept), ROLN_(start_bwd)))];
                } mid;
            } u;
        } step;
        struct {
            roln_real D[4 * ROLN_BLOCK * ROLN_(n)], Y[4 * ROLN_BLOCK * ROLN_(N)], gY[4 * ROLN_BLOCK * ROLN_(N)];
            roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 2, 2 * ROLN_BLOCK))];
            roln_real work[ROLNI_ROOM(ROLN_AE_DECODE_BWD_WORK(ROLN_, 2, 2 * ROLN_BLOCK))];
        } decode;
        roln_real encode_bwd[ROLNI_ROOM(ROLN_AE_ENCODE_BWD_WORK(ROLN_, 2, ROLN_BLOCK))];
    } u;
} ROLN_(grad_work);

/* A block of nb windows from window w0 on its way through the stations. */
typedef struct {
    const ROLN_(params) *p;
    const roln_loss *weights;
    const roln_batch *batch;
    const roln_gradient *g;
    roln_real h;          /* step in the time of the networks */
    roln_real each, step; /* 1 / number of samples, of predicted samples */
    int w0, nb;
    int scheme;  /* of the roll-out */
    int jets;    /* planes of the data: 2, or 1 without qd */
    int first;   /* first predicted sample: 1, or 2 without qd */
    int rollout; /* 0: nothing is predicted */
    ROLNI_(forced) drive;
    ROLN_(grad_work) *w;
} ROLNI_(windows);

ROLN_FN void ROLNI_(windows_start)(const ROLN_(params) *p, const roln_loss *wt, const roln_batch *batch, roln_real dt,
                                   const roln_gradient *g, ROLNI_(windows) *b, ROLN_(grad_work) *w)
{
    const int H = batch->steps;
    b->p = p, b->weights = wt, b->batch = batch, b->g = g, b->w = w;
    b->h = dt / p->scale.t;
    b->scheme = batch->qd ? ROLN_(model).scheme : ROLN_MIDPOINT;
    b->jets = batch->qd ? 2 : 1;
    b->first = batch->qd ? 1 : 2;
    b->each = 1 / ROLNI_AS(roln_real, H + 1), b->step = 1 / ROLNI_AS(roln_real, ROLN_MAX(H - b->first + 1, 1));
    b->rollout = H >= b->first && (wt->z > 0 || wt->zd > 0 || wt->q_pred > 0 || wt->qd_pred > 0);
    ROLNI_(hold_force_block)(p, ROLNI_(acts)(batch) ? w->held : NULL, g, &w->u.step.force, &b->drive);
}

/* The data of step k, scaled, to x. */
ROLN_FN void ROLNI_(windows_data)(const ROLNI_(windows) *b, int k)
{
    const roln_scale *sc = &b->p->scale;
    const int N = ROLN_(N), nb = b->nb;
    roln_real *const x = b->w->x;
    rolni_gather(b->batch, b->batch->q, N, b->w0, nb, k, 1 / sc->q, x);
    if (b->batch->qd) rolni_gather(b->batch, b->batch->qd, N, b->w0, nb, k, rolni_velocity_unit(sc), x + nb * N);
    rolni_divide_each(b->jets * nb, N, ROLNI_EACH(b->p), x);
    rolni_turn_back(&ROLN_(model).lnn, nb, x);
}

/* The force that is held from step k to k + 1, the mean over its samples, scaled, to held. */
ROLN_FN void ROLNI_(windows_force)(const ROLNI_(windows) *b, int k)
{
    ROLNI_(gather_held)(b->p, b->batch, b->w0, b->nb, k, b->w->held);
}

/* Forward: encode every sample and roll out from the first (two). Only the states Z and P are kept. */
ROLN_FN roln_status ROLNI_(windows_forward)(const ROLNI_(windows) *b)
{
    const int nb = b->nb, nz = nb * ROLN_(n);
    ROLN_(grad_work) *const w = b->w;
    roln_real *const tape = w->u.step.u.once.tape, *const work = w->u.step.u.once.work;
    int k;
    for (k = 0; k <= b->batch->steps; k++) {
        roln_real *Zk = w->Z + k * 2 * nz, *Pk = w->P + k * 2 * nz;
        roln_status st = ROLN_OK;
        ROLNI_(windows_data)(b, k);
        roln_ae_encode(&ROLN_(model).ae, b->jets, nb, b->p->theta, w->x, Zk, w->tape);
        if (!roln_all_finite(b->jets * nz, Zk)) return ROLN_E_NOT_FINITE;
        if (k == 0) rolni_copy(b->jets * nz, Zk, Pk);
        if (k == 0 || !b->rollout) continue;
        ROLNI_(windows_force)(b, k - 1);
        if (k < b->first) st = roln_lnn_start(&ROLN_(model).lnn, &b->drive.sys, 0, nb, b->h, Zk - 2 * nz, Zk, Pk, tape, work);
        else st = roln_lnn_step(&ROLN_(model).lnn, &b->drive.sys, b->scheme, 0, nb, b->h, Pk - 2 * nz, Pk, tape, work);
        if (st != ROLN_OK) return st;
    }
    return ROLN_OK;
}

/* Sample k decoded, its reconstruction beside its prediction (pred: there is one), both compared with the data, and back to z:
   gZ is set, gP is added to. */
ROLN_FN void ROLNI_(windows_decode)(const ROLNI_(windows) *b, int k, int pred, roln_real *gP)
{
    const roln_loss *wt = b->weights;
    const int N = ROLN_(N), n = ROLN_(n), nb = b->nb, nz = nb * n, nx = nb * N, rows = pred ? 2 * nb : nb;
    ROLN_(grad_work) *const w = b->w;
    const roln_real *Zk = w->Z + k * 2 * nz, *Pk = w->P + k * 2 * nz, *x = w->x;
    roln_real *const D = w->u.decode.D, *const Y = w->u.decode.Y, *const gY = w->u.decode.gY, *const tape = w->u.decode.tape;
    roln_loss *loss = b->g->loss;
    int i, j;
    for (j = 0; j < b->jets; j++) {
        rolni_copy(nz, Zk + j * nz, D + j * rows * n);
        if (pred) rolni_copy(nz, Pk + j * nz, D + j * rows * n + nz);
    }
    roln_ae_decode(&ROLN_(model).ae, b->jets, rows, b->p->theta, D, Y, tape);
    rolni_zero(b->jets * rows * N, gY);
    rolni_zero(b->jets * rows * n, D); /* from here on the cotangents of what was decoded */
    rolni_compare(b->g, rolni_term_of(b->each, wt->q, &loss->q), nx, Y, x, gY, NULL);
    if (ROLN_(model).lnn.angles && pred) rolni_next_to(&ROLN_(model).lnn, nb, Y + nx, w->x);
    if (pred) rolni_compare(b->g, rolni_term_of(b->step, wt->q_pred, &loss->q_pred), nx, Y + nx, x, gY + nx, NULL);
    if (b->jets > 1) {
        rolni_compare(b->g, rolni_term_of(b->each, wt->qd, &loss->qd), nx, Y + rows * N, x + nx, gY + rows * N, NULL);
        if (pred)
            rolni_compare(b->g, rolni_term_of(b->step, wt->qd_pred, &loss->qd_pred), nx, Y + rows * N + nx, x + nx,
                          gY + rows * N + nx, NULL);
    }
    if (!rolni_goes_back(b->g)) return;
    roln_ae_decode_bwd(&ROLN_(model).ae, b->jets, rows, b->p->theta, tape, gY, D, b->g->ae, w->u.decode.work);
    for (j = 0; j < b->jets; j++) {
        rolni_copy(nz, D + j * rows * n, w->gZ + j * nz);
        for (i = 0; pred && i < nz; i++)
            gP[j * nz + i] += D[j * rows * n + nz + i];
    }
}

/* The step, or the start, that led to sample k, and back: gP of sample k becomes gB of the one before; gZ is added to. */
ROLN_FN void ROLNI_(windows_step)(const ROLNI_(windows) *b, int k, int pred, roln_real *gP, roln_real *gB)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const roln_system *sys = &b->drive.sys;
    const int nb = b->nb, nz = nb * ROLN_(n), kept = b->scheme == ROLN_(model).scheme;
    ROLN_(grad_work) *const w = b->w;
    roln_real *const Zk = w->Z + k * 2 * nz, *const Pk = w->P + k * 2 * nz; /* the step writes Pk again; nothing reads it then */
    roln_real *const tapes = kept ? w->u.step.u.kept.tapes : w->u.step.u.mid.tapes;
    roln_real *const work = kept ? w->u.step.u.kept.work : w->u.step.u.mid.work;
    rolni_zero(2 * nz, gB);
    ROLNI_(windows_force)(b, k - 1);
    if (!pred) { /* the start from two positions */
        if (!rolni_goes_back(b->g)) return;
        (void)roln_lnn_start(lnn, sys, 1, nb, b->h, Zk - 2 * nz, Zk, Pk, w->u.step.u.mid.tapes, w->u.step.u.mid.work);
        roln_lnn_start_bwd(lnn, sys, nb, b->h, gP, gB, w->gZ, b->g->net, w->u.step.u.mid.tapes, w->u.step.u.mid.work);
        return;
    }
    if (lnn->angles) rolni_next_to(lnn, nb, Pk, Zk);
    rolni_compare(b->g, rolni_term_of(b->step, b->weights->z, &b->g->loss->z), nz, Pk, Zk, gP, w->gZ);
    if (b->jets > 1)
        rolni_compare(b->g, rolni_term_of(b->step, b->weights->zd, &b->g->loss->zd), nz, Pk + nz, Zk + nz, gP + nz, w->gZ + nz);
    if (!rolni_goes_back(b->g)) return;
    (void)roln_lnn_step(lnn, sys, b->scheme, 1, nb, b->h, Pk - 2 * nz, Pk, tapes, work);
    roln_lnn_step_bwd(lnn, sys, b->scheme, nb, b->h, gP, gB, b->g->net, tapes, work);
}

/* Backward, last sample first: decode, compare, one step back, encode. Each station recomputes its forward, so memory grows with H
   by the states only. */
ROLN_FN void ROLNI_(windows_backward)(const ROLNI_(windows) *b)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const int nb = b->nb, nz = nb * ROLN_(n);
    ROLN_(grad_work) *const w = b->w;
    roln_real *gP = w->gP, *gB = w->gB, *swap;
    int k, i;
    rolni_zero(2 * nz, gP);
    for (k = b->batch->steps; k >= 0; k--) {
        const int pred = b->rollout && k >= b->first;
        ROLNI_(windows_data)(b, k);
        ROLNI_(windows_decode)(b, k, pred, gP);
        if (b->rollout && k > 0) {
            ROLNI_(windows_step)(b, k, pred, gP, gB);
            swap = gP, gP = gB, gB = swap;
        }
        for (i = 0; b->rollout && k == 0 && i < b->jets * nz; i++) /* the roll-out began at the encoded sample */
            w->gZ[i] += gP[i];
        if (!b->g->ae) continue;
        roln_ae_encode(ae, b->jets, nb, b->p->theta, w->x, gB, w->tape); /* for its tape; gB is scratch here */
        roln_ae_encode_bwd(ae, b->jets, nb, b->p->theta, w->tape, w->gZ, NULL, b->g->ae, w->u.encode_bwd);
    }
}

/* A part of the windows, there and back. */
ROLN_FN roln_status ROLNI_(windows_block)(const ROLN_(params) *p, const roln_loss *wt, const roln_batch *batch, roln_real dt,
                                          rolni_part part, const roln_gradient *g, ROLN_(grad_work) *w)
{
    ROLNI_(windows) b;
    roln_status st;
    b.w0 = part.w0, b.nb = part.nb;
    ROLNI_(windows_start)(p, wt, batch, dt, g, &b, w);
    if ((st = ROLNI_(windows_forward)(&b)) != ROLN_OK) return st;
    ROLNI_(windows_backward)(&b);
    *g->windows += ROLNI_AS(roln_real, part.nb);
    return ROLN_OK;
}

/* scratch of NAME_grad_acc: encoded samples Z [3][block][n] and their cotangent; zd, zdd_pred; tau_z of inverse dynamics, of the
   data; data x [3][block][N], force, the encoder's tape; and that of the stations, one after the other */
typedef struct {
    roln_real Z[3 * ROLN_BLOCK * ROLN_(n)], gZ[3 * ROLN_BLOCK * ROLN_(n)];
    roln_real sd[2 * ROLN_BLOCK * ROLN_(n)], gsd[2 * ROLN_BLOCK * ROLN_(n)];
    roln_real tau[2 * ROLN_BLOCK * ROLN_(n)], gtau[2 * ROLN_BLOCK * ROLN_(n)];
    roln_real x[3 * ROLN_BLOCK * ROLN_(N)], held[ROLN_BLOCK * ROLN_(force_size)];
    roln_real tape[ROLNI_ROOM(ROLN_AE_ENCODE_TAPE(ROLN_, 3, ROLN_BLOCK))];
    union {
        struct {
            ROLNI_(force_block_work) force;
            roln_real tape[ROLN_(kept_tape)]; /* of the network; the backward wants it behind the decoder */
            union {
                roln_real stage[ROLN_MAX(ROLN_(stage_kept), ROLN_(stage_bwd))];
                roln_real inverse[ROLN_MAX(ROLN_(inverse_kept), ROLN_(inverse_bwd))];
                struct {
                    roln_real D[6 * ROLN_BLOCK * ROLN_(n)], Y[6 * ROLN_BLOCK * ROLN_(N)], gY[6 * ROLN_BLOCK * ROLN_(N)];
                    roln_real tape[ROLNI_ROOM(ROLN_AE_DECODE_TAPE(ROLN_, 3, 2 * ROLN_BLOCK))];
                    roln_real work[ROLNI_ROOM(ROLN_AE_DECODE_BWD_WORK(ROLN_, 3, 2 * ROLN_BLOCK))];
                } decode;
            } u;
        } net;
        roln_real encode_bwd[ROLNI_ROOM(ROLN_AE_ENCODE_BWD_WORK(ROLN_, 3, ROLN_BLOCK))];
    } u;
} ROLN_(grad_acc_work);

/* A block of nb samples of the acceleration loss on its way. */
typedef struct {
    const ROLN_(params) *p;
    const roln_loss *weights;
    const roln_batch *batch;
    const roln_gradient *g;
    int w0, nb;
    ROLNI_(forced) drive;
    ROLN_(grad_acc_work) *w;
} ROLNI_(samples);

/* Forward: encode, and the accelerations of the model. */
ROLN_FN roln_status ROLNI_(samples_forward)(const ROLNI_(samples) *b)
{
    const roln_scale *sc = &b->p->scale;
    const int N = ROLN_(N), nb = b->nb, nx = nb * N, nz = nb * ROLN_(n), size = ROLN_(force_size);
    const roln_real v = rolni_velocity_unit(sc);
    ROLN_(grad_acc_work) *const w = b->w;
    roln_real *const tape = w->u.net.tape;
    roln_status st = ROLN_OK;
    rolni_gather(b->batch, b->batch->q, N, b->w0, nb, 0, 1 / sc->q, w->x);
    rolni_gather(b->batch, b->batch->qd, N, b->w0, nb, 0, v, w->x + nx);
    rolni_gather(b->batch, b->batch->qdd, N, b->w0, nb, 0, v * sc->t, w->x + 2 * nx);
    rolni_divide_each(3 * nb, N, ROLNI_EACH(b->p), w->x);
    roln_ae_encode(&ROLN_(model).ae, 3, nb, b->p->theta, w->x, w->Z, w->tape);
    if (!roln_all_finite(3 * nz, w->Z)) return ROLN_E_NOT_FINITE;
    if (b->batch->tau) {
        rolni_gather(b->batch, b->batch->tau, size, b->w0, nb, 0, ROLNI_(input_unit)(b->p), w->held);
        ROLNI_(own_inputs)(b->p, nb, w->held);
    } else if (ROLN_(actuator) > 0) {
        rolni_zero(nb * size, w->held);
    }
    if (b->weights->force > 0) /* only its status */
        st = roln_lnn_inverse(&ROLN_(model).lnn, 1, nb, b->drive.sys.theta, w->Z, NULL, w->Z + 2 * nz, w->tau, tape,
                              w->u.net.u.inverse);
    return st == ROLN_OK ? rolni_stage(&ROLN_(model).lnn, &b->drive.sys, 1, nb, w->Z, w->sd, tape, w->u.net.u.stage) : st;
}

/* Reconstruction z, zd, zdd and prediction z, zd, zdd_pred decoded, compared with the data, and back: gZ and gsd are set. */
ROLN_FN void ROLNI_(samples_decode)(const ROLNI_(samples) *b)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const roln_loss *wt = b->weights;
    const int N = ROLN_(N), n = ROLN_(n), nb = b->nb, nz = nb * n, nx = nb * N;
    ROLN_(grad_acc_work) *const w = b->w;
    const roln_real *x = w->x;
    roln_real *const D = w->u.net.u.decode.D, *const Y = w->u.net.u.decode.Y, *const gY = w->u.net.u.decode.gY;
    roln_loss *loss = b->g->loss;
    int i, j;
    for (j = 0; j < 3; j++) {
        rolni_copy(nz, w->Z + j * nz, D + 2 * j * nz);
        rolni_copy(nz, j < 2 ? w->Z + j * nz : w->sd + nz, D + 2 * j * nz + nz);
    }
    roln_ae_decode(ae, 3, 2 * nb, b->p->theta, D, Y, w->u.net.u.decode.tape);
    rolni_zero(6 * nx, gY);
    rolni_zero(6 * nz, D); /* from here on the cotangents of what was decoded */
    rolni_compare(b->g, rolni_term_of(1, wt->q, &loss->q), nx, Y, x, gY, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qd, &loss->qd), nx, Y + 2 * nx, x + nx, gY + 2 * nx, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qdd, &loss->qdd), nx, Y + 4 * nx, x + 2 * nx, gY + 4 * nx, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qdd_pred, &loss->qdd_pred), nx, Y + 5 * nx, x + 2 * nx, gY + 5 * nx, NULL);
    if (!rolni_goes_back(b->g)) return;
    roln_ae_decode_bwd(ae, 3, 2 * nb, b->p->theta, w->u.net.u.decode.tape, gY, D, b->g->ae, w->u.net.u.decode.work);
    for (j = 0; j < 3; j++)
        for (i = 0; i < nz; i++)
            w->gZ[j * nz + i] = D[2 * j * nz + i] + (j < 2 ? D[2 * j * nz + nz + i] : 0);
    rolni_zero(nz, w->gsd);
    rolni_copy(nz, D + 5 * nz, w->gsd + nz);
}

/* Backward: decode, compare in z, the accelerations, inverse dynamics, encode. */
ROLN_FN void ROLNI_(samples_backward)(const ROLNI_(samples) *b)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const roln_real *th = ROLNI_(net)(b->p);
    const int nb = b->nb, nz = nb * ROLN_(n);
    const int back = rolni_goes_back(b->g);
    ROLN_(grad_acc_work) *const w = b->w;
    roln_real *const tau = w->tau, *const gtau = w->gtau, *const tape = w->u.net.tape, *const work = w->u.net.u.inverse;
    roln_loss *loss = b->g->loss;
    ROLNI_(samples_decode)(b);
    rolni_compare(b->g, rolni_term_of(1, b->weights->zdd, &loss->zdd), nz, w->sd + nz, w->Z + 2 * nz, w->gsd + nz, w->gZ + 2 * nz);
    if (back) rolni_stage_bwd(lnn, &b->drive.sys, nb, w->gsd, w->gZ, b->g->net, tape, w->u.net.u.stage);
    if (b->weights->force > 0) {
        const roln_force *force = b->drive.sys.force;
        rolni_zero(nz, tau + nz);
        rolni_zero(2 * nz, gtau);
        if (force) force->eval(force->ctx, nb, w->Z, tau + nz);
        (void)roln_lnn_inverse(lnn, 1, nb, th, w->Z, NULL, w->Z + 2 * nz, tau, tape, work); /* again, for its tape */
        rolni_divide_deviation(2 * nb, ROLN_(n), b->g->force_variance, tau);
        ROLNI_(drop_driven)(2 * nb, tau);
        rolni_compare(b->g, rolni_term_of(1, b->weights->force, &loss->force), nz, tau, tau + nz, gtau, gtau + nz);
        ROLNI_(drop_driven)(2 * nb, gtau);
        if (!back) return;
        rolni_divide_deviation(2 * nb, ROLN_(n), b->g->force_variance, gtau);
        roln_lnn_inverse_bwd(lnn, nb, th, gtau, w->gZ, w->gZ + 2 * nz, b->g->net, tape, work);
        if (force) force->bwd(force->ctx, nb, w->Z, gtau + nz, 1, w->gZ);
    }
    if (b->g->ae) roln_ae_encode_bwd(&ROLN_(model).ae, 3, nb, b->p->theta, w->tape, w->gZ, NULL, b->g->ae, w->u.encode_bwd);
}

/* A part of the samples, there and back. */
ROLN_FN roln_status ROLNI_(samples_block)(const ROLN_(params) *p, const roln_loss *wt, const roln_batch *batch, rolni_part part,
                                          const roln_gradient *g, ROLN_(grad_acc_work) *w)
{
    ROLNI_(samples) b;
    roln_status st;
    b.p = p, b.weights = wt, b.batch = batch, b.g = g, b.w0 = part.w0, b.nb = part.nb, b.w = w;
    ROLNI_(hold_force_block)(p, ROLNI_(acts)(batch) ? w->held : NULL, g, &w->u.net.force, &b.drive);
    if ((st = ROLNI_(samples_forward)(&b)) != ROLN_OK) return st;
    ROLNI_(samples_backward)(&b);
    *g->windows += ROLNI_AS(roln_real, part.nb);
    return ROLN_OK;
}

/* What both gradients ask of their arguments first. */
ROLN_FN roln_status ROLNI_(grad_valid)(const ROLN_(params) *p, const roln_batch *b)
{
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!rolni_batch_valid(b) || (ROLN_(driven) > 0 && !b->qd)) return ROLN_E_LENGTH;
    return roln_all_finite(ROLN_(theta_size), p->theta) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Adds the gradient of the acceleration loss over single samples (paper Eq. 12), b->steps = 0, b->qdd given:
       |phi(rho(q)) - q|^2 + |J D qd - qd|^2 + .. of the 3-jet + |zdd_pred - zdd|^2 + |decoded zdd_pred - qdd|^2 + |inverse dynamics
   - tau_z|^2 each times its weight. The last, `force`: where known forces work against gravity and inertia it fixes M and g
   themselves, whereas zdd only knows M^-1 of them (with tau = 0 it would draw M to 0). Else as NAME_grad. */
ROLN_FN roln_status ROLN_(grad_acc)(const ROLN_(params) *p, const roln_loss *weights, const roln_batch *b, ROLN_(gradient) *g,
                                    ROLN_(grad_acc_work) *w)
{
    const roln_gradient rest = roln_gradient_of(&ROLN_(model), g->rest.theta, &g->rest.loss, &g->rest.windows);
    roln_gradient to = roln_gradient_of(&ROLN_(model), g->theta, &g->loss, &g->windows);
    roln_status st = ROLNI_(grad_valid)(p, b);
    rolni_part part = {0, 0};
    int added = 0;
    to.rest = &rest;
    if (st != ROLN_OK) return st;
    if (!b->qd || !b->qdd) return ROLN_E_LENGTH;
    for (; part.w0 < b->count && st == ROLN_OK; part.w0 += part.nb) {
        part = rolni_part_of(b, part.w0, ROLN_BLOCK);
        st = ROLNI_(samples_block)(p, weights, b, part, &rest, w);
        if (st == ROLN_OK && ++added % ROLNI_PARTS == 0) rolni_gradient_fold(&ROLN_(model), &to);
    }
    if (added > 0) rolni_gradient_fold(&ROLN_(model), &to);
    return st;
}

/* Adds the gradient of the ODE loss over windows of H = b->steps <= ROLN_HORIZON steps of dt seconds (paper Eq. 13): encoder,
   roll-out, decoder, and straight back, the encoded targets not detached. Per window, with mean over its samples:
       |phi(rho(q)) - q|^2 + |J D qd - qd|^2 (h = 0..H)      |zd_pred - zd|^2 + |qd_pred - qd|^2 (h = 1..H), ...
   each times its weight. With H = 0 and weights for q, qd only, it trains the autoencoder alone. Without b->qd the variational
   loss, of positions only: the first two start the discrete motion (roln_lnn_start), the midpoint rule carries it on, and the terms
   in z, q_pred compare h = 2..H: the discrete Euler-Lagrange equations as a prediction error, H >= 2. Adds the sum over windows to
   g->theta, the unweighted terms to g->loss (without the prediction terms if all their weights are 0) and the count to g->windows,
   as if in twice the digits (held by test_sums.c). A block of windows that fails (data or parameters not finite, eigenvalues out of
   range) adds nothing and ends the call. A cotangent that overflows is not looked for here: the update refuses it. Status of
   roln_lnn_step, ROLN_E_NOT_FINITE; ROLN_E_LENGTH: count or steps negative, windows longer than ROLN_HORIZON, stride below 1, no qd
   or qdd for the acceleration loss, H < 2 for a prediction from positions, or positions alone of a model with driven joints. Of
   scratch only the states grow with H. */
ROLN_FN roln_status ROLN_(grad)(const ROLN_(params) *p, const roln_loss *weights, const roln_batch *b, roln_real dt,
                                ROLN_(gradient) *g, ROLN_(grad_work) *w)
{
    const roln_gradient rest = roln_gradient_of(&ROLN_(model), g->rest.theta, &g->rest.loss, &g->rest.windows);
    roln_gradient to = roln_gradient_of(&ROLN_(model), g->theta, &g->loss, &g->windows);
    roln_status st = b->steps > ROLN_HORIZON ? ROLN_E_LENGTH : ROLNI_(grad_valid)(p, b);
    rolni_part part = {0, 0};
    int added = 0;
    to.rest = &rest;
    if (st != ROLN_OK) return st;
    if (!b->qd && b->steps < 2 && (weights->z > 0 || weights->q_pred > 0)) return ROLN_E_LENGTH;
    for (; part.w0 < b->count && st == ROLN_OK; part.w0 += part.nb) {
        part = rolni_part_of(b, part.w0, ROLN_BLOCK);
        st = ROLNI_(windows_block)(p, weights, b, dt, part, &rest, w);
        if (st == ROLN_OK && ++added % ROLNI_PARTS == 0) rolni_gradient_fold(&ROLN_(model), &to);
    }
    if (added > 0) rolni_gradient_fold(&ROLN_(model), &to);
    return st;
}

/* Optimiser state: zero it once. Saved and restored with the parameters it resumes bit for bit. */
typedef struct {
    roln_adam adam;
    roln_real m[ROLN_(theta_size)], v[ROLN_(moment_size)], v_max[ROLN_(moment_size)];
} ROLN_(optimiser);

/* The manifold of the parameters: per layer a biorthogonal pair (learning-rate group 0) and a bias (2), of a chart its polynomials
   (2), then the networks, the base point, the SPD layers, the input map or the actuators (group 1). */
static const roln_block ROLN_(table)[] = {ROLNI_EACH_LAYER(ROLNI_LAYER_BLOCKS, ROLNI_COMMA),
                                          {ROLN_EUCLIDEAN, ROLN_(monomials), ROLN_(bent), 2},
                                          {ROLN_EUCLIDEAN, 1, ROLN_(net_size), 1},
                                          {ROLN_BASE ? &roln_spd : ROLN_EUCLIDEAN, ROLN_BASE ? ROLN_(n) : 0,
                                           ROLN_BASE ? ROLN_(n) : 0, 1},
                                          ROLNI_SPD_BLOCKS(ROLN_(L0), ROLN_(n)), ROLNI_SPD_BLOCKS(ROLN_(L1), ROLN_(n)),
                                          ROLNI_SPD_BLOCKS(ROLN_(L2), ROLN_(n)), ROLNI_SPD_BLOCKS(ROLN_(L3), ROLN_(n)),
                                          {ROLN_EUCLIDEAN, ROLN_(N), ROLN_(input_size) / ROLN_(N), 1}};
ROLNI_INTS
    ROLN_(blocks) = sizeof ROLN_(table) / sizeof *ROLN_(table),
    ROLN_(behind) = ROLN_(blocks) - 11, /* the first block behind the autoencoder */
    ROLN_(verb_work) = ROLNI_VERB_WORK(ROLN_) /* numbers of work of the hungriest manifold */
ROLNI_INTS_END;

/* scratch of NAME_update */
typedef struct {
    roln_real work[ROLNI_ROOM(ROLN_(keep_size) + ROLN_(verb_work))];
} ROLN_(update_work);

/* One step of Riemannian Adam with the mean of the gradients in g. An autoencoder with driven joints stays as it is. p,
   o stay as they were unless ROLN_OK. ROLN_E_NOT_FINITE: the gradient is not, or holds no window, or a setting is not or is
   negative; status of the retractions (roln_adam_update). */
ROLN_FN roln_status ROLN_(update)(ROLN_(params) *p, const roln_opt *opt, ROLN_(optimiser) *o, const ROLN_(gradient) *g,
                                  ROLN_(update_work) *w)
{
    const int first = ROLN_(keeps) > 0 ? ROLN_(behind) : 0, from = ROLN_(keeps) > 0 ? ROLN_(ae_size) : 0;
    const roln_moments moments = {o->m, o->v, o->v_max};
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return roln_adam_update(ROLN_(blocks) - first, ROLN_(table) + first, opt, 1 / g->windows, g->theta + from, p->theta + from,
                            &o->adam, &moments, w->work);
}

#if ROLN_GN_ROWS > 0
/* At most ROLN_GN_ROWS residuals r, and the rows J of their derivatives by what ROLN_LEARN names, with room for one more. weight:
   by which large ones are scaled down; expect, next: the residuals that are expected where a step ends, and those that are there.
   The signs of row k are drawn from seed + k. force_variance: the caller's, NAME_force_variance; rows of samples divide the force
   residual of each latent coordinate by its root. All 0, as after memset: they do not. */
typedef struct {
    uint64_t seed;
    roln_real force_variance[ROLN_(n)];
    roln_real r[ROLN_GN_ROWS], weight[ROLN_GN_ROWS], expect[ROLN_GN_ROWS], next[ROLN_GN_ROWS];
    roln_real J[(ROLN_GN_ROWS + 1) * ROLN_(newton_size)];
} ROLN_(residuals);

/* Gauss-Newton from step to step. Zero it once, and set state to ROLN_NEWTON_START. With the parameters it resumes bit for bit. */
typedef struct {
    roln_newton state;
    ROLN_(params) next; /* where the step ends */
    roln_real carried[ROLN_(newton_size)]; /* what earlier rows still ask for, or the last step (roln_newton_rows) */
    roln_real keep[ROLN_(newton_size)], S[ROLN_(newton_side) * (ROLN_(newton_side) + 1)];
    union {
        roln_real rows[ROLNI_ROOM(ROLN_(verb_work))], sums[ROLN_SYM_WORK];
        roln_real step[ROLN_NEWTON_STEP_WORK(ROLN_GN_ROWS, ROLN_(newton_size), ROLN_(verb_work))];
    } work;
} ROLN_(newton);

/* The blocks that it moves. */
ROLNI_INTS
    ROLN_(newton_from) = ROLNI_LEARN(ROLN_LEARN) ? ROLN_(ae_size) : 0,
    ROLN_(newton_first) = ROLNI_LEARN(ROLN_LEARN) ? ROLN_(behind) : 0,
    ROLN_(newton_blocks) = ROLN_(blocks) - ROLN_(newton_first)
ROLNI_INTS_END;

/* Writes the weights w [NAME_newton_size] of a ridge for polynomials (roln_newton_opt.ridge). The ridge keeps the polynomials small
   beyond the data. With p_i polynomial i and x = (reach, .., reach), but 1 for cosines and sines of angles:
       w_i = ridge p_i(x)^2                      for a coefficient of M or R
       w_i = ridge (sum_j dp_i/dx_j (x))^2       for a coefficient of V
   Constants, terms of degree 1 and all other parameters have w_i = 0. No w_i exceeds 1 / eps^2. reach: 1.3 times the largest |z_j|
   of the data, for example. The function has two numbers on the stack for each polynomial. */
ROLN_FN void ROLN_(newton_ridge)(roln_real ridge, roln_real reach, roln_real w[ROLN_AT_LEAST(ROLN_(newton_size))])
{
    enum { ROLNI_IN = ROLN_(net_inputs) };
    const roln_lnn *f = &ROLN_(model).lnn;
    const rolni_nets all = rolni_nets_of(f);
    roln_real z[ROLNI_IN], one[ROLNI_IN], p[ROLN_(planes_1)], slope[ROLN_(planes_1)];
    int k, i, h;
    for (i = 0; i < ROLNI_IN; i++)
        z[i] = i >= f->n || roln_lnn_angle(f, i) ? 1 : reach, one[i] = 1;
    rolni_zero(ROLN_(newton_size), w);
    for (k = 0; k < all.count && ROLN_(polynomials) > 0; k++) {
        const roln_mlp *const net = all.net[k];
        const roln_real *const of = k == 1 ? slope : p;
        rolni_polynomials(ROLNI_IN, net->degree, 1, z, 0, p, 0);
        rolni_polynomials_along(ROLNI_IN, net->degree, z, p, one, slope);
        for (i = 0; i < net->size[2]; i++)
            for (h = 0; h < net->size[1] - ROLNI_IN; h++) {
                const roln_real x = ridge * of[h] * of[h], most = 1 / (ROLN_EPS * ROLN_EPS);
                w[ROLN_(ae_size) - ROLN_(newton_from) + all.at[k] + i * net->size[1] + ROLNI_IN + h] = x < most ? x : most;
            }
    }
}

/* Returns how many constants of the mass network tell the scale of M: those of L, or of the diagonal of U. *from: the first of them
   in theta. */
ROLN_FN int ROLNI_(constants)(int *from)
{
    const roln_lnn *f = &ROLN_(model).lnn;
    *from = ROLN_(ae_size) + rolni_potential_at(f) - rolni_outputs(f);
    return f->mass == ROLN_CHOLESKY ? rolni_outputs(f) : f->n;
}

/* The scale of M in a model of polynomials, a logarithm, from the constants b of the mass network alone: log(|b|^2 / n) with
   cholesky and squares, sum_i b_i / n with the exponential. */
ROLN_FN roln_real ROLN_(scale_of)(const ROLN_(params) *p)
{
    const roln_real n = ROLNI_AS(roln_real, ROLN_(n));
    int from, i;
    const int count = ROLNI_(constants)(&from);
    roln_real sum = 0;
    for (i = 0; i < count; i++)
        sum += ROLN_(cholesky) ? p->theta[from + i] * p->theta[from + i] : p->theta[from + i];
    return ROLN_(cholesky) ? roln_log(sum / n) : sum / n;
}

/* Writes row `at` of g: residual weight (hold - NAME_scale_of), and its derivative. Motion without forces leaves a common factor of
   M, V and R free, which a ridge would make ever smaller. This row holds it. ROLN_E_LENGTH: g has no row `at`. ROLN_E_NOT_FINITE:
   the scale of M is not finite. g is then as it was. */
ROLN_FN roln_status ROLN_(scale_row)(const ROLN_(params) *p, roln_real hold, roln_real weight, int at, ROLN_(residuals) *g)
{
    const roln_real scale = ROLN_(scale_of)(p), n = ROLNI_AS(roln_real, ROLN_(n));
    int from, i;
    const int count = ROLNI_(constants)(&from);
    const roln_real each = ROLN_(cholesky) ? 2 / (n * roln_exp(scale)) : 1 / n;
    roln_real *row;
    if (at < 0 || at >= ROLN_GN_ROWS) return ROLN_E_LENGTH;
    if (!roln_finite(scale) || !roln_finite(each)) return ROLN_E_NOT_FINITE;
    row = g->J + ROLNI_AS(size_t, at) * ROLN_(newton_size);
    rolni_zero(ROLN_(newton_size), row);
    for (i = 0; i < count; i++)
        row[from - ROLN_(newton_from) + i] = weight * each * (ROLN_(cholesky) ? p->theta[from + i] : 1);
    g->r[at] = weight * (hold - scale);
    return ROLN_OK;
}

/* scratch of NAME_rows */
typedef union {
    ROLN_(grad_acc_work) grad_acc;
    ROLN_(grad_work) grad;
} ROLN_(rows_work);

/* Residuals at .. at + b->count - 1 of g at p, and their rows, for Gauss-Newton (roln_newton_rows): row w, of window w, is the
   derivative by the parameters of
       f = sum_i xi_i sqrt(weight_i) (model - data)_i
   over all numbers i that the loss of the window compares, xi_i = +-1 at random; r_w = -f. So E r^2 is the loss of the window and
   E J^T J its Gauss-Newton matrix, at one backward a row; a window may be listed several times for several rows (Hutchinson 1990).
   Single samples with b->qdd and b->steps = 0: the acceleration loss; else windows (NAME_grad). The same signs come again for the
   same seed, so that a step can be judged by its own rows. again: the residuals alone, to g->next, p being o->next. ROLN_E_LENGTH:
   they do not fit into g, the windows are longer than ROLN_HORIZON, or as NAME_grad. Statuses of NAME_grad_acc or NAME_grad; on a
   status other than ROLN_OK J and r are scratch, and the residual of the window that failed is infinite, so that
   NAME_newton_accept refuses a step that led there. Threads may fill different rows at the same time, each with work of its own. */
ROLN_FN roln_status ROLN_(rows)(const ROLN_(params) *p, const roln_loss *weights, const roln_batch *b, roln_real dt, int at,
                                int again, ROLN_(residuals) *g, ROLN_(rows_work) *w)
{
    const int behind = ROLNI_LEARN(ROLN_LEARN), cols = ROLN_(newton_size), acceleration = b->qdd && b->steps == 0;
    roln_status st;
    int k;
    if (b->steps > ROLN_HORIZON || at < 0 || b->count < 0 || at > ROLN_GN_ROWS - b->count) return ROLN_E_LENGTH;
    if ((st = ROLNI_(grad_valid)(p, b)) != ROLN_OK) return st;
    if (acceleration ? !b->qd : !b->qd && b->steps < 2 && (weights->z > 0 || weights->q_pred > 0)) return ROLN_E_LENGTH;
    for (k = 0; k < b->count && st == ROLN_OK; k++) {
        roln_real *row = again ? NULL : g->J + ROLNI_AS(size_t, at + k) * ROLNI_AS(size_t, cols), windows = 0;
        roln_real *const r = (again ? g->next : g->r) + at + k;
        uint64_t signs = g->seed + ROLNI_AS(uint64_t, at + k);
        roln_loss aside;
        roln_gradient to;
        to.ae = behind ? NULL : row, to.net = !row ? NULL : behind ? row : row + ROLN_(ae_size);
        to.loss = &aside, to.windows = &windows, to.signs = &signs, to.residual = r, to.rest = NULL;
        to.force_variance = g->force_variance[0] > 0 ? g->force_variance : NULL;
        *r = 0;
        if (row) rolni_zero(cols, row);
        st = acceleration ? ROLNI_(samples_block)(p, weights, b, rolni_part_of(b, k, 1), &to, &w->grad_acc)
                          : ROLNI_(windows_block)(p, weights, b, dt, rolni_part_of(b, k, 1), &to, &w->grad);
        if (st != ROLN_OK) *r = rolni_real(ROLNI_INF);
    }
    return st;
}

/* count rows are complete: they and what is carried from earlier ones become tangents at p (roln_newton_rows). ROLN_E_LENGTH:
   count. Of the system in the rows, NAME_newton_size > 8 count, count must not change from step to step. */
ROLN_FN roln_status ROLN_(newton_rows)(const ROLN_(params) *p, const roln_newton_opt *opt, int count, ROLN_(residuals) *g,
                                       ROLN_(newton) *o)
{
    if (count < 1 || count > ROLN_GN_ROWS) return ROLN_E_LENGTH;
    rolni_copy(ROLN_(newton_size), o->carried, g->J + ROLNI_AS(size_t, count) * ROLN_(newton_size));
    return roln_newton_rows(ROLN_(newton_blocks), ROLN_(table) + ROLN_(newton_first), opt, count, p->theta + ROLN_(newton_from),
                            g->J, g->r, g->weight, &o->state, o->work.rows);
}

/* Their sums, rows from .. to - 1 of the system: 0, NAME_newton_side for all, unless two threads share them. */
ROLN_FN void ROLN_(newton_normal_equations)(const roln_newton_opt *opt, int count, int from, int to, const ROLN_(residuals) *g,
                                            ROLN_(newton) *o, roln_real work[ROLN_AT_LEAST(ROLN_SYM_WORK)])
{
    roln_newton_normal_equations(opt, count, ROLN_(newton_size), from, to, g->J, o->S, work);
}

/* A step from p to o->next, with g->expect (roln_newton_step). ROLN_E_LENGTH: count. */
ROLN_FN roln_status ROLN_(newton_step)(const ROLN_(params) *p, const roln_newton_opt *opt, int count, ROLN_(residuals) *g,
                                       ROLN_(newton) *o)
{
    roln_newton_system system;
    system.R = count, system.P = ROLN_(newton_size), system.J = g->J, system.r = g->r, system.S = o->S;
    if (count < 1 || count > ROLN_GN_ROWS) return ROLN_E_LENGTH;
    memcpy(&o->next, p, sizeof *p);
    return roln_newton_step(ROLN_(newton_blocks), ROLN_(table) + ROLN_(newton_first), opt, &system, p->theta + ROLN_(newton_from),
                            &o->state, o->next.theta + ROLN_(newton_from), g->expect, o->keep, o->work.step);
}

/* Nonzero if the step is taken: then p becomes o->next. It is judged by the first `judges` of its count rows, of which g->next has
   the residuals at o->next: NAME_rows with again = 1, whatever its status. */
ROLN_FN int ROLN_(newton_accept)(ROLN_(params) *p, int count, int judges, ROLN_(residuals) *g, ROLN_(newton) *o)
{
    if (count < 1 || count > ROLN_GN_ROWS || judges < 1 || judges > count) return 0;
    if (!roln_newton_accept(judges, g->r, g->weight, g->expect, g->next, &o->state)) {
        if (ROLN_NEWTON_SIDE(count, ROLN_(newton_size)) < ROLN_(newton_size)) {
            rolni_zero(ROLN_(newton_size), o->carried);
            rolni_zero(ROLN_(newton_size), g->J + ROLNI_AS(size_t, count) * ROLN_(newton_size));
        }
        return 0;
    }
    memcpy(p, &o->next, sizeof *p);
    rolni_copy(ROLN_(newton_size), o->keep, o->carried);
    return 1;
}
#else
ROLNI_ASSERT(rows_must_be_a_number_that_the_preprocessor_can_read, (ROLN_GN_ROWS) <= 0)
#endif

/* ---- 17 scales and first weights ------------------------------------------------------------- */

/* scratch of NAME_variance: a sample, encoded; means, and what they lose by rounding; the encoder's tape */
typedef struct {
    roln_real xz[3 * (ROLN_(N) + ROLN_(n))], mean[3 * (ROLN_(N) + ROLN_(n))], rest[3 * (ROLN_(N) + ROLN_(n))];
    roln_real tape[ROLNI_ROOM(ROLN_AE_ENCODE_TAPE(ROLN_, 3, 1))];
} ROLN_(variance_work);

/* Variance of the data of each loss term over the windows of b (first samples; b->qdd may be NULL), in its scaled units: of q, qd,
   qdd, and of the encoded z, zd, zdd; 1 where there are no data, and for the force, whose coordinates have a variance each
   (NAME_force_variance). roln_loss_divide(&weights, &var) makes every term of a loss count in parts of its own variance.
   ROLN_E_LENGTH: no window. ROLN_E_NOT_FINITE (also for data at rest). var is untouched unless ROLN_OK. */
ROLN_FN roln_status ROLN_(variance)(const ROLN_(params) *p, const roln_batch *b, roln_loss *var, ROLN_(variance_work) *w)
{
    const roln_lnn *lnn = &ROLN_(model).lnn;
    const int N = ROLN_(N), n = ROLN_(n), jets = !b->qd ? 1 : !b->qdd ? 2 : 3, dim = jets * (N + n);
    const roln_real f = rolni_velocity_unit(&p->scale), each = 1 / ROLNI_AS(roln_real, ROLN_MAX(b->count, 1));
    roln_real *const x = w->xz, *const z = x + jets * N, *const mean = w->mean, *const rest = w->rest;
    roln_real sum[6] = {0, 0, 0, 0, 0, 0}, lost[6] = {0, 0, 0, 0, 0, 0}; /* of sum, as rest of mean */
    int k, i, j, pass;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!rolni_batch_valid(b) || b->count < 1) return ROLN_E_LENGTH;
    rolni_zero(dim, mean);
    rolni_zero(dim, rest);
    for (pass = 0; pass < 2; pass++)
        for (k = 0; k < b->count; k++) {
            rolni_gather(b, b->q, N, k, 1, 0, 1 / p->scale.q, x);
            if (jets > 1) rolni_gather(b, b->qd, N, k, 1, 0, f, x + N);
            if (jets > 2) rolni_gather(b, b->qdd, N, k, 1, 0, f * p->scale.t, x + 2 * N);
            rolni_divide_each(jets, N, ROLNI_EACH(p), x);
            roln_ae_encode(&ROLN_(model).ae, jets, 1, p->theta, x, z, w->tape);
            if (lnn->angles) { /* q and z are the same */
                rolni_copy(n, pass == 0 ? b->q + rolni_sample(b, 0, 0) * ROLNI_AS(size_t, N) : mean, z);
                rolni_turn_back(lnn, 1, z); /* far from 0 digits would be lost */
                rolni_next_to(lnn, 1, z, x);
                rolni_copy(n, x, z);
            }
            for (i = 0; i < dim; i++) { /* x, and z behind it */
                if (pass == 0) {
                    rest[i] += each * x[i];
                } else {
                    j = i < jets * N ? i / N : 3 + (i - jets * N) / n;
                    lost[j] += each * (x[i] - mean[i]) * (x[i] - mean[i]);
                }
            }
            if (pass == 0) rolni_fold(dim, mean, rest);
            else rolni_fold(6, sum, lost);
        }
    for (j = 0; j < 6; j++) {
        if (j % 3 >= jets) sum[j] = 1;
        if (!roln_finite(sum[j]) || !(sum[j] > 0)) return ROLN_E_NOT_FINITE;
    }
    var->q = var->q_pred = sum[0], var->qd = var->qd_pred = sum[1], var->qdd = var->qdd_pred = sum[2];
    var->z = sum[3], var->zd = sum[4], var->zdd = sum[5];
    var->force = 1;
    return ROLN_OK;
}

/* scratch of NAME_fit_inertia and NAME_force_variance: sums of forces and accelerations beyond those of the first sample; a sample,
   encoded, its force */
typedef struct {
    double sum[ROLN_MAX(ROLN_(n), ROLN_(inputs)) + ROLN_(n)], square[ROLN_MAX(ROLN_(n), ROLN_(inputs)) + ROLN_(n)];
    roln_real first[ROLN_MAX(ROLN_(n), ROLN_(inputs)) + ROLN_(n)];
    roln_real x[3 * ROLN_(N)], z[3 * ROLN_(n)], in[ROLN_(force_size)], tau_z[ROLN_(n)];
    union {
        roln_real encode[ROLNI_ROOM(ROLN_AE_ENCODE_TAPE(ROLN_, 3, 1))];
        ROLNI_(force_work) force;
    } u;
} ROLN_(fit_inertia_work);

typedef ROLN_(fit_inertia_work) ROLN_(force_variance_work);

/* Variances of tau_z [n], or of u [inputs], and behind them of zdd [n], over the windows of b, to w->square; scaled, with unit of
   inertia 1. That of a force that never changes is 0. */
ROLN_FN roln_status ROLNI_(force_moments)(const ROLN_(params) *p, const roln_batch *b, ROLN_(fit_inertia_work) *w)
{
    const int N = ROLN_(N), n = ROLN_(n), inputs = ROLN_(inputs), size = ROLN_(force_size), forces = inputs > 0 ? inputs : n;
    const roln_real v = rolni_velocity_unit(&p->scale), unit = rolni_force_unit(&p->scale) * p->scale.m;
    const double rest = 64 * ROLNI_AS(double, ROLN_EPS);
    roln_real *const x = w->x, *const z = w->z, *const in = w->in;
    ROLNI_(forced) d;
    int k, i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    if (!rolni_batch_valid(b) || b->count < 1 || !b->qd || !b->qdd || !b->tau) return ROLN_E_LENGTH;
    ROLNI_(hold_force)(p, in, w->u.force.tau, w->u.force.tape, w->u.force.work, &d);
    for (k = 0; k < b->count; k++) {
        rolni_gather(b, b->q, N, k, 1, 0, 1 / p->scale.q, x);
        rolni_gather(b, b->qd, N, k, 1, 0, v, x + N);
        rolni_gather(b, b->qdd, N, k, 1, 0, v * p->scale.t, x + 2 * N);
        rolni_divide_each(3, N, ROLNI_EACH(p), x);
        roln_ae_encode(&ROLN_(model).ae, 3, 1, p->theta, x, z, w->u.encode);
        if (!roln_all_finite(3 * n, z)) return ROLN_E_NOT_FINITE;
        rolni_gather(b, b->tau, size, k, 1, 0, ROLN_(actuator) > 0 || ROLN_(driven) > 0 ? ROLNI_(input_unit)(p) : unit, in);
        ROLNI_(own_inputs)(p, 1, in);
        if (inputs == 0) ROLNI_(torque_eval)(&d.torque, 1, z, w->tau_z);
        for (i = 0; i < n && (ROLN_(actuator) > 0 || ROLN_(driven) > 0); i++)
            w->tau_z[i] *= p->scale.m;
        rolni_zero(ROLN_(driven), w->tau_z + n - ROLN_(driven)); /* no forces */
        for (i = 0; i < forces + n; i++) {
            const roln_real y = i >= forces ? z[2 * n + i - forces] : inputs > 0 ? in[i] : w->tau_z[i];
            double off;
            if (k == 0) w->first[i] = y, w->sum[i] = w->square[i] = 0;
            off = ROLNI_AS(double, y) - ROLNI_AS(double, w->first[i]);
            w->sum[i] += off / b->count, w->square[i] += off * off / b->count;
        }
    }
    for (i = 0; i < forces + n; i++) {
        const double mean = ROLNI_AS(double, w->first[i]) + w->sum[i];
        w->square[i] -= w->sum[i] * w->sum[i];
        if (!roln_finite(ROLNI_AS(roln_real, w->square[i]))) return ROLN_E_NOT_FINITE;
        if (!(w->square[i] > rest * rest * mean * mean)) w->square[i] = 0; /* it only rounds */
    }
    return ROLN_OK;
}

/* p->scale.m, the unit of inertia of a machine whose forces are known, before training, for it changes what the weights mean: the
   geometric mean, over latent coordinates, of the deviation of tau_z over that of zdd. Of the windows of b the first samples count.
   A coordinate whose force or acceleration never changes does not count. The networks begin with M = I, and logarithms of ten and
   more would be out of their reach. tau_z = J^T tau or, of a model with inputs, the deviation of all u: B is learned. With
   actuators tau is that of their gains as they are, k = 1 at the start.
   Forces times 2^k give the unit times 2^k, to the bit. b with qdd and tau. ROLN_E_LENGTH: no window, or without these;
   ROLN_E_NOT_FINITE, also for a machine whose forces do not change, or beyond 1e+-18. p stays as it was unless ROLN_OK. Cost:
   NAME_encode_reference and NAME_reduce for each window. */
ROLN_FN roln_status ROLN_(fit_inertia)(ROLN_(params) *p, const roln_batch *b, ROLN_(fit_inertia_work) *w)
{
    const int n = ROLN_(n), inputs = ROLN_(inputs), forces = inputs > 0 ? inputs : n;
    double *const force = w->square, *const moved = w->square + forces;
    const roln_status st = ROLNI_(force_moments)(p, b, w);
    roln_real logs = 0;
    int power = 0, count = 0, i;
    if (st != ROLN_OK) return st;
    for (i = 1; i < forces && inputs > 0; i++)
        force[0] += force[i];
    for (i = 1; i < n && inputs > 0; i++)
        moved[0] += moved[i];
    for (i = 0; i < (inputs > 0 ? 1 : n); i++) {
        const roln_real ratio = ROLN_SQRT(ROLNI_AS(roln_real, force[i])) / ROLN_SQRT(ROLNI_AS(roln_real, moved[i]));
        const roln_bits bits = rolni_bits(ratio), one = ROLNI_BIAS << ROLNI_MANT;
        if (force[i] == 0 || moved[i] == 0) continue;
        if (!(ratio > ROLN_C(1e-18)) || !(ratio < ROLN_C(1e18))) return ROLN_E_NOT_FINITE;
        power += ROLNI_AS(int, bits >> ROLNI_MANT) - ROLNI_AS(int, ROLNI_BIAS); /* ratio = 2^power times 1 .. 2 */
        logs += roln_log(rolni_real((bits & ((ROLNI_AS(roln_bits, 1) << ROLNI_MANT) - 1)) | one));
        count++;
    }
    if (count == 0) return ROLN_E_NOT_FINITE;
    i = power / count - (power % count < 0); /* power = i count + 0 .. count - 1 */
    logs += ROLNI_AS(roln_real, power - i * count) * ROLN_C(0.6931471805599453);
    p->scale.m = roln_exp(logs / ROLNI_AS(roln_real, count)) *
                 rolni_real(ROLNI_AS(roln_bits, i + ROLNI_AS(int, ROLNI_BIAS)) << ROLNI_MANT);
    return ROLN_OK;
}

/* Variance [n] of the force tau_z = J^T tau on each latent coordinate over the windows of b (first samples), in p's units: what
   the term `force` of the loss is divided by in rows (NAME_residuals), so that each coordinate counts in parts of its own force. A
   coordinate whose force never changes, such as a joint without motor or a driven one, has the variance of zdd: that of its force
   if M = I. It has 1 if it does not move either. Choose the unit of inertia first (NAME_fit_inertia). ROLN_E_LENGTH,
   ROLN_E_NOT_FINITE: as NAME_fit_inertia. ROLN_E_SHAPE: the model has inputs or actuators, so its forces are learned. variance is
   untouched unless ROLN_OK. Cost: that of NAME_fit_inertia. */
ROLN_FN roln_status ROLN_(force_variance)(const ROLN_(params) *p, const roln_batch *b, roln_real variance[ROLN_(n)],
                                          ROLN_(force_variance_work) *w)
{
    const double unit = 1 / ROLNI_AS(double, p->scale.m);
    const int n = ROLN_(n);
    const roln_status st = ROLN_(inputs) > 0 || ROLN_(actuator) > 0 ? ROLN_E_SHAPE : ROLNI_(force_moments)(p, b, w);
    int changes = 0, i;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++) {
        const double own = w->square[i] * unit * unit;
        changes |= own > 0;
        w->square[i] = own > 0 ? own : w->square[n + i] > 0 ? w->square[n + i] : 1;
        w->first[i] = ROLNI_AS(roln_real, w->square[i]);
        if (!roln_finite(w->first[i]) || !(w->first[i] > 0)) return ROLN_E_NOT_FINITE;
    }
    if (!changes) return ROLN_E_NOT_FINITE;
    rolni_copy(n, w->first, variance);
    return ROLN_OK;
}

/* scratch of NAME_init_pod, of a sum in double and of numbers */
typedef struct {
    double room[ROLNI_ROOM(ROLN_AE_POD_ROOM(ROLN_))];
    roln_real work[ROLNI_ROOM(ROLN_AE_POD_WORK(ROLN_))];
} ROLN_(init_pod_work);

/* scratch of NAME_init */
typedef struct {
    roln_real work[ROLNI_ROOM(ROLN_AE_INIT_WORK(ROLN_))];
} ROLN_(init_work);

/* Random weights (scales 1, no range, input map 0). Status of roln_ae_init. */
ROLN_FN roln_status ROLN_(init)(ROLN_(params) *p, uint64_t *seed, ROLN_(init_work) *w)
{
    roln_real *each = ROLNI_EACH(p);
    int i;
    memset(p, 0, sizeof *p);
    p->slope = ROLN_(model).ae.slope, p->eigenvalue_floor = ROLN_(model).lnn.eigenvalue_floor;
    p->scale.q = p->scale.t = p->scale.m = 1;
    if (each)
        for (i = 0; i < ROLN_(N); i++)
            each[i] = 1;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    ROLNI_(actuator_init)(p);
#endif
    roln_lnn_init(&ROLN_(model).lnn, p->theta + ROLN_(ae_size), seed);
    return roln_ae_init(&ROLN_(model).ae, p->theta, seed, w->work);
}

/* z_j becomes ignorable (cyclic): M, V and R no longer depend on it, and stay so in training and on the device (roln_lnn_ignore).
   Without autoencoder it is joint j. Call it between NAME_init or NAME_init_pod and the training. ROLN_E_LENGTH: j is not in
   0 .. n - 1. */
ROLN_FN roln_status ROLN_(ignore)(ROLN_(params) *p, int j)
{
    if (j < 0 || j >= ROLN_(n)) return ROLN_E_LENGTH;
    roln_lnn_ignore(&ROLN_(model).lnn, j, p->theta + ROLN_(ae_size));
    return ROLN_OK;
}

/* Nonzero if z_j is ignorable; 0 of a j that is not in 0 .. n - 1. */
ROLN_FN int ROLN_(ignores)(const ROLN_(params) *p, int j)
{
    return j >= 0 && j < ROLN_(n) && roln_lnn_ignores(&ROLN_(model).lnn, j, p->theta + ROLN_(ae_size));
}

/* Linear optimum: scales and the POD autoencoder from the samples q, qd [count][N], random networks, with ROLN_CHART four times as
   steep as those of NAME_init (roln_lnn_steepen). qbar [N] out.
   Status of roln_fit_scale, roln_ae_init_pod; p then holds no model. */
ROLN_FN roln_status ROLN_(init_pod)(ROLN_(params) *p, int count, const roln_real *q, const roln_real *qd,
                                    roln_real qbar[ROLN_AT_LEAST(ROLN_(N))], uint64_t *seed, ROLN_(init_pod_work) *w)
{
    roln_status st;
    memset(p, 0, sizeof *p);
    st = roln_fit_scale(&ROLN_(model), count, q, qd, qbar, &p->scale, ROLNI_EACH(p));
    if (st == ROLN_OK && ROLN_(ae_layers) > 0)
        st = roln_ae_init_pod(&ROLN_(model).ae, count, q, 1 / p->scale.q, ROLNI_EACH(p), p->theta, w->room, w->work);
    if (st != ROLN_OK) return st;
    p->slope = ROLN_(model).ae.slope, p->eigenvalue_floor = ROLN_(model).lnn.eigenvalue_floor;
#if ROLNI_ACTUATOR(ROLN_ACTUATOR) > 0
    ROLNI_(actuator_init)(p);
#endif
    roln_lnn_init(&ROLN_(model).lnn, p->theta + ROLN_(ae_size), seed);
    if (ROLN_(degree) > 0) roln_lnn_steepen(&ROLN_(model).lnn, 4, p->theta + ROLN_(ae_size)); /* z is in [-1, 1] */
    return ROLN_OK;
}

#if ROLNI_AT(1, ROLN_CHART) > 0

/* ---- 18 a chart in closed form --------------------------------------------------------------- */

/* Sums of a chart in closed form, numbers that may be merged by adding them: zero it once. */
typedef struct {
    double sums[ROLN_CHART_SUMS(ROLN_)];
} ROLN_(chart);

/* scratch of NAME_chart_add */
typedef struct {
    double room[ROLN_CHART_ADD_ROOM(ROLN_)];
    roln_real work[ROLN_CHART_ADD_WORK(ROLN_)];
} ROLN_(chart_add_work);

/* Add the samples q [count][N] to c (roln_chart_add), for the encoder in p. A sample that is not finite ends the call; those before
   it are added, c->sums[0] is how many there are. */
ROLN_FN roln_status ROLN_(chart_add)(const ROLN_(params) *p, int count, const roln_real *q, ROLN_(chart) *c,
                                     ROLN_(chart_add_work) *w)
{
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return roln_chart_add(&ROLN_(model).ae, p->theta, count, q, 1 / p->scale.q, ROLNI_EACH(p), c->sums, w->room, w->work);
}

/* Add the sums of other samples for the same encoder. */
ROLN_FN void ROLN_(chart_merge)(const ROLN_(chart) *from, ROLN_(chart) *to)
{
    roln_chart_merge(ROLN_CHART_SUMS(ROLN_), from->sums, to->sums);
}

/* scratch of NAME_chart_solve */
typedef struct {
    double room[ROLN_CHART_SOLVE_ROOM(ROLN_)];
} ROLN_(chart_solve_work);

/* The decoder of the bent layer that fits c best, with ridge |W|^2 (roln_chart_solve; ROLN_CHART_RIDGE is usual). residual [1]:
   what it leaves, in parts of the deviation of the samples from their mean. p and residual stay as they were unless ROLN_OK. */
ROLN_FN roln_status ROLN_(chart_solve)(ROLN_(params) *p, const ROLN_(chart) *c, roln_real ridge, roln_real *residual,
                                       ROLN_(chart_solve_work) *w)
{
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    return roln_chart_solve(&ROLN_(model).ae, c->sums, ridge, p->theta, residual, w->room);
}

/* Coordinates in which the range in p (NAME_fit_range) is -1 .. 1, W = 0 (roln_chart_center); NAME_init_pod ends in such already. p
   stays as it was unless ROLN_OK. */
ROLN_FN roln_status ROLN_(chart_center)(ROLN_(params) *p)
{
    roln_status st;
    int i;
    if (ROLN_(params_mismatch)(p)) return ROLN_E_SHAPE;
    for (i = 0; i < ROLN_(n); i++) {
        const roln_real half = p->z_max[i] / 2 - p->z_min[i] / 2;
        if (half > 0 && !roln_finite(p->zd_max[i] / half)) return ROLN_E_NOT_FINITE;
    }
    st = roln_chart_center(&ROLN_(model).ae, p->z_min, p->z_max, p->theta);
    for (i = 0; i < ROLN_(n) && st == ROLN_OK; i++) {
        p->zd_max[i] /= p->z_max[i] / 2 - p->z_min[i] / 2;
        p->z_min[i] = -1, p->z_max[i] = 1;
    }
    return st;
}

/* The encoder of a chart. Coordinates z of the same space of columns of Psi have the same polynomials, whatever their scale and
   origin: what the best decoder leaves of the samples is a function of that space. Its logarithm is made small by Riemannian L-BFGS
   over Psi with orthonormal columns, each value a fit in closed form. Columns of driven joints are not moved, and the others are 0
   in their rows: what a coordinate has of driven ones does not change that space. */

#define ROLN_REFINE_PAIRS 20 /* steps that L-BFGS remembers in NAME_chart_refine */

/* Scratch of a fit for one encoder: a block of samples, their spread, modes, a gradient and what it loses by rounding. */
typedef struct {
    roln_real low[ROLN_(n)], high[ROLN_(n)], top[ROLN_(n)], x[ROLN_CHART_BLOCK * ROLN_(N)], cov[2 * ROLN_(n) * ROLN_(n)];
    roln_real dual[ROLN_(n) * ROLN_(n)], modes[ROLN_(n) * ROLN_(n)], gm[ROLN_(n) * ROLN_(bent)], rest[ROLN_(n) * ROLN_(bent)];
    roln_real shear[ROLNI_ROOM((ROLN_(n) - ROLN_(keeps)) * ROLN_(keeps))];
    union {
        ROLN_(encode_work) encode;
        roln_real frame[ROLN_SPD_FRAME_WORK(ROLN_(n))], add[ROLN_CHART_ADD_WORK(ROLN_)];
        roln_real grad[ROLN_CHART_GRAD_WORK(ROLN_, ROLN_CHART_BLOCK)];
    } u;
} ROLNI_(encoder_work);

/* Steps for the encoder: zero it once. Saved and restored with the parameters they resume bit for bit; what stands behind keep is
   scratch. */
typedef struct {
    roln_lbfgs state;
    roln_real psi[ROLN_(n) * ROLN_(bent)]; /* [n][N_{L-1}] orthonormal rows */
    roln_real from[ROLN_(bent)];           /* [N_{L-1}] z is measured from here: b of the start */
    roln_real keep[ROLN_LBFGS_KEEP(ROLN_REFINE_PAIRS, ROLN_(n) * ROLN_(bent))];
    double sums[ROLN_CHART_SUMS(ROLN_)], room[ROLN_MAX(ROLN_CHART_ADD_ROOM(ROLN_), ROLN_CHART_SOLVE_ROOM(ROLN_))];
    roln_real kept[(2 * ROLN_(n) + 1 + ROLN_(monomials)) * ROLN_(bent)]; /* the layer before a step */
    roln_real step[ROLN_LBFGS_WORK(ROLN_REFINE_PAIRS, ROLN_(n) * ROLN_(bent), ROLN_STIEFEL_BLOCK_WORK(ROLN_(n), ROLN_(bent)))];
    ROLNI_(encoder_work) encoder;
} ROLN_(refinement);

/* The fit for one encoder. */
typedef struct {
    ROLN_(params) *p;
    const roln_batch *batch;
    ROLN_(refinement) *turn;
    roln_real residual; /* of the last fit */
    roln_status status;
} ROLNI_(encoder);

/* Samples at .. of the batch, a block of them, scaled, to x; returns how many. */
ROLN_FN int ROLNI_(encoder_block)(const ROLNI_(encoder) *f, int at)
{
    const int left = f->batch->count - at, now = ROLN_MIN(left, ROLN_CHART_BLOCK);
    roln_real *const x = f->turn->encoder.x;
    rolni_gather(f->batch, f->batch->q, ROLN_(N), at, now, 0, 1 / f->p->scale.q, x);
    rolni_divide_each(now, ROLN_(N), ROLNI_EACH(f->p), x);
    return now;
}

/* cov(z) and the mean of zd zd^T, [2][n][n], to cov; sums are scratch. */
ROLN_FN roln_status ROLNI_(encoder_spread)(ROLNI_(encoder) *f)
{
    const int n = ROLN_(n);
    const double count = f->batch->count;
    ROLNI_(encoder_work) *const w = &f->turn->encoder;
    double *const mean = f->turn->sums, *const square = mean + n;
    int k, i, j;
    for (i = 0; i < n + 2 * n * n; i++)
        mean[i] = 0;
    for (k = 0; k < f->batch->count; k++) {
        const size_t row = rolni_sample(f->batch, k, 0) * ROLNI_AS(size_t, ROLN_(N));
        const roln_real *const z = w->u.encode.s, *const zd = z + n;
        const roln_status st = ROLNI_(encode)(f->p, f->batch->q + row, f->batch->qd + row, NULL, w->u.encode.s, w->u.encode.tape);
        if (st != ROLN_OK) return st;
        for (i = 0; i < n; i++) {
            mean[i] += ROLNI_AS(double, z[i]) / count;
            for (j = 0; j < n; j++) {
                square[i * n + j] += ROLNI_AS(double, z[i]) * ROLNI_AS(double, z[j]) / count;
                square[(n + i) * n + j] += ROLNI_AS(double, zd[i]) * ROLNI_AS(double, zd[j]) / count;
            }
        }
    }
    for (i = 0; i < n; i++)
        for (j = 0; j < n; j++)
            square[i * n + j] -= mean[i] * mean[j];
    for (i = 0; i < 2 * n * n; i++)
        w->cov[i] = ROLNI_AS(roln_real, square[i]);
    return ROLN_OK;
}

/* cov, A = cov(z) and X the mean of zd zd^T, become those of the free coordinates alone, [2][moved][moved], less what follows
   the driven ones, z_f - B z_d, B = A_fd A_dd^-1 [moved][kept], to shear:
       A_ff - A_fd B^T,   X_ff - B X_df - X_fd B^T + B X_dd B^T
   ROLN_E_ILL_CONDITIONED: a driven joint does not move by itself. */
ROLN_FN roln_status ROLNI_(encoder_free)(ROLNI_(encoder_work) *w)
{
    const int n = ROLN_(n), kept = ROLN_(keeps), moved = n - kept;
    roln_real *const A = w->cov, *const X = A + n * n, *const B = w->shear, *const D = w->dual, *const Y = w->modes;
    int i, j, k;
    for (i = 0; i < kept; i++)
        rolni_copy(kept, A + (moved + i) * n + moved, D + i * kept);
    if (roln_chol(kept, D, D) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
    for (i = 0; i < moved; i++) {
        rolni_copy(kept, A + i * n + moved, B + i * kept);
        roln_solve_lower(kept, D, B + i * kept, B + i * kept);
        roln_solve_lower_t(kept, D, B + i * kept, B + i * kept);
    }
    for (i = 0; i < moved; i++) /* X_f. - B X_d. */
        for (j = 0; j < n; j++) {
            Y[i * n + j] = X[i * n + j];
            for (k = 0; k < kept; k++)
                Y[i * n + j] -= B[i * kept + k] * X[(moved + k) * n + j];
        }
    for (i = 0; i < moved; i++)
        for (j = 0; j <= i; j++) {
            const roln_real *const b = B + j * kept;
            A[i * moved + j] = A[i * n + j] - roln_dot(kept, A + i * n + moved, b);
            X[i * moved + j] = Y[i * n + j] - roln_dot(kept, Y + i * n + moved, b);
            A[j * moved + i] = A[i * moved + j], X[j * moved + i] = X[i * moved + j];
        }
    return ROLN_OK;
}

/* Psi and Phi become modes of motion of the samples, slow ones first: coordinates in which neither positions nor velocities are
   correlated, as in normal modes, where M and the stiffness are diagonal. dual and modes are V and W of the frame of cov(zd) at
   cov(z) (roln_spd_frame). Driven joints stay as they are, and the others are measured from where they
   follow them. ROLN_E_ILL_CONDITIONED: to working precision the samples lie in fewer than n dimensions. */
ROLN_FN roln_status ROLNI_(encoder_modes)(ROLNI_(encoder) *f, const roln_real *psi, roln_real *layer)
{
    const int n = ROLN_(n), bent = ROLN_(bent), kept = ROLN_(keeps), moved = n - kept;
    ROLNI_(encoder_work) *const w = &f->turn->encoder;
    roln_real *const A = w->cov, *const X = A + n * n;
    roln_status st = ROLNI_(encoder_spread)(f);
    int k, i, j;
    if (st != ROLN_OK) return st;
    if (!roln_all_finite(2 * n * n, A)) return ROLN_E_NOT_FINITE;
    if (kept > 0 && (st = ROLNI_(encoder_free)(w)) != ROLN_OK) return st;
    if (roln_chol(moved, A, A) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
    if ((st = roln_spd_frame(moved, A, X, w->low, w->dual, w->modes, w->u.frame)) != ROLN_OK) return st;
    roln_mm(moved, moved, bent, w->dual, psi, layer);
    roln_mm(moved, moved, bent, w->modes, psi, layer + n * bent);
    for (k = 0; k < kept; k++) {
        roln_real *const phi = layer + (moved + k) * bent;
        rolni_zero(bent, phi);
        phi[bent - kept + k] = 1;
        for (i = 0; i < moved; i++) {
            roln_real *const own = layer + (n + i) * bent + bent - kept + k;
            for (j = 0; j < bent - kept; j++)
                phi[j] += w->shear[i * kept + k] * psi[i * bent + j];
            for (*own = 0, j = 0; j < moved; j++)
                *own -= w->modes[i * moved + j] * w->shear[j * kept + k];
        }
    }
    return ROLN_OK;
}

/* Modes of the space of psi in which the samples lie in [-1, 1], and the best decoder for them. low, high, top: least and largest
   z, largest |zd|, before they are stretched. */
ROLN_FN roln_status ROLNI_(encoder_fit)(ROLNI_(encoder) *f, const roln_real *psi)
{
    const roln_ae *ae = &ROLN_(model).ae;
    const int n = ROLN_(n), bent = ROLN_(bent), moved = n - ROLN_(keeps);
    ROLN_(refinement) *const t = f->turn;
    ROLNI_(encoder_work) *const w = &t->encoder;
    roln_real *layer = f->p->theta + rolni_bent_at(ae);
    roln_status st;
    int k, now, i;
    rolni_copy(moved * bent, psi, layer + n * bent);
    rolni_zero(ROLN_(keeps) * bent, layer + (n + moved) * bent);
    for (i = moved; i < n; i++)
        layer[(n + i) * bent + bent - n + i] = 1;
    rolni_copy(bent, t->from, layer + 2 * n * bent);
    if ((st = ROLNI_(encoder_modes)(f, psi, layer)) != ROLN_OK) return st;
    if ((st = ROLNI_(range)(f->p, f->batch, w->low, w->high, w->top, &w->u.encode)) != ROLN_OK) return st;
    if ((st = roln_chart_center(ae, w->low, w->high, f->p->theta)) != ROLN_OK) return st;
    for (i = 0; i < ROLN_CHART_SUMS(ROLN_); i++)
        t->sums[i] = 0;
    for (k = 0; k < f->batch->count; k += now) {
        now = ROLNI_(encoder_block)(f, k);
        st = roln_chart_add(ae, f->p->theta, now, w->x, 1, NULL, t->sums, t->room, w->u.add);
        if (st != ROLN_OK) return st;
    }
    return roln_chart_solve(ae, t->sums, ROLN_CHART_RIDGE, f->p->theta, &f->residual, t->room);
}

/* log of the residual, sqrt((sum |v - C^T f|^2 + ridge count |W|^2) / sum |v - mean|^2), for roln_lbfgs_step; below ROLN_EPS it
   counts as nothing. g leaves out what the coordinates of Psi do to |W|, a little of what is itself little. */
ROLN_FN roln_real ROLNI_(encoder_value)(void *ctx, const roln_real *psi, roln_real *g)
{
    ROLNI_(encoder) *f = ROLNI_AS(ROLNI_(encoder) *, ctx);
    const roln_ae *ae = &ROLN_(model).ae;
    const int n = ROLN_(n), bent = ROLN_(bent), m = 1 + n + ROLN_(monomials), moved = n - ROLN_(keeps);
    ROLNI_(encoder_work) *const w = &f->turn->encoder;
    const roln_real *W = f->p->theta + rolni_ae_layers(ae);
    const double *sums = f->turn->sums;
    double sum = 0, W2 = 0, both;
    int k, now, i, j;
    f->status = ROLNI_(encoder_fit)(f, psi);
    if (f->status != ROLN_OK) return rolni_real(ROLNI_INF);
    rolni_zero(n * bent, w->gm);
    rolni_zero(n * bent, w->rest);
    for (k = 0; k < f->batch->count; k += now) {
        now = ROLNI_(encoder_block)(f, k);
        roln_chart_grad(ae, f->p->theta, now, w->x, 1, &sum, w->rest, w->u.grad);
        if ((k + now) % (128 * ROLNI_PARTS) == 0) rolni_fold(n * bent, w->gm, w->rest);
    }
    rolni_fold(n * bent, w->gm, w->rest);
    for (i = 0; i < ROLN_(monomials) * bent; i++)
        W2 += ROLNI_AS(double, W[i]) * ROLNI_AS(double, W[i]);
    both = sum + ROLNI_AS(double, ROLN_CHART_RIDGE) * sums[0] * W2;
    f->residual = ROLN_SQRT(ROLNI_AS(roln_real, both / rolni_chart_spread(m, bent, sums)));
    for (i = 0; i < moved; i++) { /* of psi, from that of modes psi, stretched */
        const roln_real half = w->high[i] / 2 - w->low[i] / 2, unit = both > 0 ? ROLNI_AS(roln_real, 2 * both) * half : 1;
        for (j = 0; j < moved; j++)
            w->modes[i * moved + j] /= unit;
    }
    roln_mm_at(moved, moved, bent, w->modes, w->gm, g);
    for (i = 1; i <= moved; i++)
        rolni_zero(ROLN_(keeps), g + i * bent - ROLN_(keeps));
    return roln_log(ROLN_MAX(f->residual, ROLN_EPS));
}

/* The first step begins with the encoder in p. */
ROLN_FN roln_status ROLNI_(refine_start)(const ROLN_(params) *p, ROLN_(refinement) *t)
{
    const roln_lbfgs start = ROLN_LBFGS_START;
    const int n = ROLN_(n), bent = ROLN_(bent), kept = ROLN_(keeps);
    const roln_real *layer = p->theta + rolni_bent_at(&ROLN_(model).ae);
    roln_real *row = t->psi;
    int i, j;
    t->state = start;
    rolni_copy(bent, layer + 2 * n * bent, t->from);
    rolni_copy(n * bent, layer + n * bent, t->psi);
    for (i = 0; i < n - kept; i++, row += bent) {
        roln_real size;
        rolni_zero(kept, row + bent - kept);
        size = ROLN_SQRT(roln_dot(bent, row, row));
        for (j = 0; j < bent; j++)
            row[j] /= size;
    }
    return rolni_orthonormal(n - kept, bent, t->psi, t->step);
}

/* One step for the encoder of the bent layer, behind NAME_init_pod, on the first samples of the windows of b, a few thousand that
   show all of the motion, the same ones in every step, until the residual [1] falls by less than a hundredth in 20 steps. p becomes
   a model with the encoder that the step led to, in coordinates that are modes of the samples' motion, slow ones first, z
   uncorrelated and zd, too, in which the samples lie in [-1, 1], and with Phi, b and W fitted to them, with ROLN_CHART_RIDGE, and
   the range that fits them. residual: what is left as in roln_chart_solve, but with the ridge; no step raises it. Then
   NAME_chart_add, NAME_chart_solve and NAME_fit_range with all samples.
   p and residual stay as they were unless ROLN_OK. ROLN_E_NO_CONVERGENCE: no step lowers the residual, which is the end; the first
   call then fits the start, with ROLN_OK. ROLN_E_LENGTH: no sample or no qd; ROLN_E_ILL_CONDITIONED: columns of Psi are dependent,
   or to working precision the samples lie in fewer than n dimensions; else as NAME_encode, roln_chart_center, roln_chart_add,
   roln_chart_solve. Cost: one fit, now and then several, 40 at most; a fit is ROLN_CHART_SUMS multiply-adds in double and
   5 F N_{L-1} more for each sample, and a solve. */
ROLN_FN roln_status ROLN_(chart_refine)(ROLN_(params) *p, const roln_batch *b, ROLN_(refinement) *turn, roln_real *residual)
{
    const roln_block encoder = {&roln_stiefel, ROLN_(n) - ROLN_(keeps), ROLN_(bent), 0};
    const int size = (2 * ROLN_(n) + 1 + ROLN_(monomials)) * ROLN_(bent);
    roln_real *const layer = p->theta + rolni_bent_at(&ROLN_(model).ae);
    const ROLNI_(encoder_work) *const w = &turn->encoder;
    ROLNI_(encoder) fit;
    roln_status st = ROLNI_(grad_valid)(p, b);
    int i;
    fit.p = p, fit.batch = b, fit.turn = turn, fit.residual = 0, fit.status = ROLN_OK;
    if (st != ROLN_OK) return st;
    if (b->count < 1 || !b->qd) return ROLN_E_LENGTH;
    if (turn->state.t == 0 && (st = ROLNI_(refine_start)(p, turn)) != ROLN_OK) return st;
    rolni_copy(size, layer, turn->kept);
    st = roln_lbfgs_step(1, &encoder, ROLN_REFINE_PAIRS, ROLNI_(encoder_value), &fit, &turn->state, turn->psi, turn->keep,
                         turn->step);
    if (st == ROLN_E_NO_CONVERGENCE && turn->state.t == 0) { /* the start is the best encoder: fitted, it is the first step */
        turn->state.t = 1;
        st = ROLNI_(encoder_fit)(&fit, turn->psi);
    }
    if (st != ROLN_OK) {
        rolni_copy(size, turn->kept, layer);
        return st == ROLN_E_NOT_FINITE && fit.status != ROLN_OK ? fit.status : st;
    }
    for (i = 0; i < ROLN_(n); i++) { /* the last fit was that of the step */
        p->zd_max[i] = w->top[i] / (w->high[i] / 2 - w->low[i] / 2);
        p->z_min[i] = -1, p->z_max[i] = 1;
    }
    *residual = fit.residual;
    return ROLN_OK;
}

#else
ROLNI_ASSERT(degree_must_be_a_number_that_the_preprocessor_can_read, ROLN_(degree) == 0)
#endif
#endif

/* ---- 19 keeping a model ---------------------------------------------------------------------- */

/* Parameters to and from bytes (roln_pack, roln_unpack), and as a C definition NAME_weights through put. */
ROLN_FN void ROLN_(pack)(const ROLN_(params) *p, unsigned char bytes[ROLN_AT_LEAST(ROLN_(packed_size))])
{
    roln_pack(&ROLN_(model), p, bytes);
}

/* Parameters from the count bytes of NAME_pack (roln_unpack). p is written only on ROLN_OK. */
ROLN_FN roln_status ROLN_(unpack)(int count, const unsigned char *bytes, ROLN_(params) *p)
{
    return roln_unpack(&ROLN_(model), count, bytes, p);
}

ROLN_FN roln_status ROLN_(write)(const ROLN_(params) *p, roln_put put, void *ctx)
{
    return roln_write(&ROLN_(model), ROLNI_STR(ROLN_NAME), p, put, ctx);
}

ROLNI_INTS ROLN_(numbers) = sizeof(ROLN_(params)) / sizeof(roln_real) ROLNI_INTS_END; /* of NAME_params */

/* Are the parameters in memory what they were? A CRC-32 over all of them, count numbers a call, so that a tick spends little on it:
   16 numbers take 480 instructions on a Cortex-M4F, all of them NAME_numbers / 16 calls. The first pass takes the reference:
   go through it at the start, NAME_check(p, NAME_numbers, c), when they have just been unpacked; or set c->reference, which is the
   same on every machine, and c->valid = 1. A pass that ends otherwise, and every call from there on: ROLN_E_CHECKSUM
   (roln_check_step). All damage within 32 bits in a row is seen, and all of two bits anywhere; at the latest two passes after it
   was done. Parameters that learn: zero c whenever they have changed. */
ROLN_FN roln_status ROLN_(check)(const ROLN_(params) *p, int count, roln_check *c)
{
    return roln_check_step(ROLN_(numbers), p, count, c);
}

#if ROLNI_BITS(ROLN_QUANTISE) > 0
typedef union { uint32_t words[sizeof(ROLN_(params)) / 4]; ROLN_(params) params; } ROLN_(words); /* what NAME_write writes */

/* scratch of NAME_quantise: the numbers of the full model, as NAME_params has them */
typedef struct {
    struct {
        roln_real slope, eigenvalue_floor;
        roln_scale scale;
#if ROLNI_OWN(ROLN_SCALE)
        roln_real each[ROLN_(N)];
#endif
        roln_real dt, z_min[ROLN_(n)], z_max[ROLN_(n)], zd_max[ROLN_(n)], theta[ROLN_(full_size)];
    } full;
    roln_real work[ROLNI_ROOM(ROLN_AE_QUANTISE_WORK(ROLN_))];
} ROLN_(quantise_work);

/* Parameters from the count bytes that NAME_pack of the same model with ROLN_QUANTISE full wrote, after NAME_fit_range. Status of
   roln_unpack, roln_ae_quantise (ROLN_E_RANGE without a range z_min[i] < z_max[i] for all i); p is written only on ROLN_OK. */
ROLN_FN roln_status ROLN_(quantise)(int count, const unsigned char *bytes, ROLN_(params) *p, ROLN_(quantise_work) *w)
{
    const roln_real *net;
    roln_model full = ROLN_(model);
    roln_status st;
    full.ae.storage = ROLN_FULL;
    net = w->full.theta + roln_ae_params(&full.ae);
    st = roln_unpack(&full, count, bytes, &w->full);
    if (st == ROLN_OK) st = roln_ae_quantise(&ROLN_(model).ae, w->full.theta, w->full.z_min, w->full.z_max, p->theta, w->work);
    if (st != ROLN_OK) return st;
    memcpy(p, &w->full, sizeof *p - sizeof p->theta);
    rolni_copy(ROLN_(rest_size), net, p->theta + ROLN_(ae_size));
    return ROLN_OK;
}
#endif

/* ---- 20 scratch of a program ----------------------------------------------------------------- */

/* Scratch of a tick, of prediction and of NAME_doubt, one upon the other. One for each main loop, task and interrupt:
   NAME_tick(.., &work.tick). NAME_linear, _lqr, _lqr_along, _filter_tick, _observer_tick, _doubt_ahead and _plan_.. take scratch of
   their own, for most of them need more. */
typedef union {
    ROLN_(encode_work) encode;
    ROLN_(encode_reference_work) encode_reference;
    ROLN_(decode_work) decode;
    ROLN_(step_work) step;
    ROLN_(reduce_work) reduce;
    ROLN_(lift_work) lift;
    ROLN_(dynamics_work) dynamics;
    ROLN_(inverse_work) inverse;
    ROLN_(inertia_work) inertia;
    ROLN_(control_work) control;
    ROLN_(allocate_work) allocate;
    ROLN_(gains_work) gains;
    ROLN_(guard_tick_work) guard_tick;
#if ROLN_DELAY > 0
    ROLN_(ahead_work) ahead;
#endif
    ROLN_(tick_work) tick;
    ROLN_(doubt_work) doubt;
} ROLN_(work);

/* Scratch of training. No function of prediction and control leaves anything in its scratch, so a program that trains between its
   ticks may put NAME_work and NAME_train into a union of its own. */
typedef union {
    ROLN_(errors_work) errors;
    ROLN_(fit_range_work) fit_range;
    ROLN_(fit_limits_work) fit_limits;
    ROLN_(fit_noise_work) fit_noise;
    ROLN_(fit_observer_work) fit_observer;
    ROLN_(evidence_add_work) evidence_add;
    ROLN_(fit_doubt_work) fit_doubt;
    ROLN_(fit_outlook_work) fit_outlook;
#if ROLNI_BITS(ROLN_QUANTISE) == 0
    ROLN_(grad_work) grad;
    ROLN_(grad_acc_work) grad_acc;
    ROLN_(update_work) update;
    ROLN_(variance_work) variance;
    ROLN_(force_variance_work) force_variance;
    ROLN_(fit_inertia_work) fit_inertia;
#if ROLN_GN_ROWS > 0
    ROLN_(rows_work) rows;
#endif
#endif
} ROLN_(train);

#if ROLNI_BITS(ROLN_QUANTISE) == 0
/* Scratch of initialisation, and of charts in closed form. */
typedef union {
    ROLN_(init_work) init;
    ROLN_(init_pod_work) init_pod;
#if ROLNI_AT(1, ROLN_CHART) > 0
    ROLN_(chart_add_work) chart_add;
    ROLN_(chart_solve_work) chart_solve;
#endif
} ROLN_(start);
#else
typedef union { ROLN_(quantise_work) quantise; } ROLN_(start);
#endif

/* 1 if the model that was included last has a chart, and so NAME_chart_..; else 0: for programs that are compiled for any model. */
#undef ROLN_CHARTED
#if ROLNI_AT(1, ROLN_CHART) > 0
#define ROLN_CHARTED 1
#else
#define ROLN_CHARTED 0
#endif

#undef ROLN_NAME
#undef ROLN_AE
#undef ROLN_MLP
#undef ROLN_POLYNOMIALS
#undef ROLN_INTEGRATOR
#undef ROLN_FILTER
#undef ROLN_SLOPE
#undef ROLN_CHART
#undef ROLN_BASE
#undef ROLN_MASS
#undef ROLN_LAYERS
#undef ROLN_EIGENVALUE_FLOOR
#undef ROLN_DAMPING
#undef ROLN_FRICTION
#undef ROLN_STICTION
#undef ROLNI_ADVANCE_JAC_WORK
#undef ROLN_ANGLES
#undef ROLN_SCALE
#undef ROLNI_EACH
#undef ROLN_INPUTS
#undef ROLN_ACTUATOR
#undef ROLN_DRIVEN
#undef ROLN_HORIZON
#undef ROLN_BLOCK
#undef ROLN_QUANTISE
#undef ROLN_GN_ROWS
#undef ROLN_LEARN
#undef ROLN_LOAD
#undef ROLN_DELAY
#undef ROLNI_ACTING
#undef ROLNI_COMING
#undef ROLNI_LOAD_OF
#undef ROLNI_LAST_OF_FILTER
#undef ROLNI_LAST_OF_OBSERVER
#undef ROLN_PLAN

#endif /* ROLN_NAME */
