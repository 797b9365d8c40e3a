/* SPDX-License-Identifier: MIT */
/* roln.h - reduced-order Lagrangian neural networks: learn a small mechanical model from motion, run it in firmware.

   Define the model, include this file; include it again with other definitions for the next model.

       #define ROLN_NAME    arm               prefix of every generated name
       #define ROLN_AE      16, 12, 8, 4      N, hidden .., n: autoencoder; a single number: no autoencoder, N = n
       #define ROLN_MLP     64, 64            hidden widths of the networks
       #define ROLN_STEP    rk4               euler, rk4 or midpoint; default rk4
       #define ROLN_SLOPE   0.41421356        slope k of the activation, in (0, 1], default tan(pi/8); 1: none, all linear
       #define ROLN_CHART   polynomial, 3     the innermost layer has a linear encoder and a decoder that is polynomial to this
                                              degree, 2 .. 8, in place of the activation; default none
       #define ROLN_MASS    exponential       mass matrix: exponential, exp_P(U); or cholesky, L L^T + least I
       #define ROLN_BASE    0                 1: learned base point P of the exponential; default 0, P = I
       #define ROLN_LAYERS  gyro, gyro        SPD layers behind the exponential: gyro, 4 at most; default none
       #define ROLN_LEAST   1e-4              smallest eigenvalue that cholesky allows
       #define ROLN_DAMPING 0                 1: learned dissipation R(z)
       #define ROLN_FRICTION 0                1: learned dry friction c_j tanh(zd_j / v_j) of each latent coordinate
       #define ROLN_ANGLES  1, 0              for each joint, 1: it is an angle in radians and may turn round, 0: it is not; without
                                              autoencoder, at most 31 joints; default: none is
       #define ROLN_SCALE   each              each joint has a unit of its own, fitted to its motion: for joints of different kinds,
                                              metres beside radians; default common, all have the same
       #define ROLN_INPUTS  0                 number of inputs u of a learned input map, tau = B u; default 0: tau is given
       #define ROLN_HORIZON 8                 longest training window in steps; default 8
       #define ROLN_BLOCK   16                training windows computed together (memory against speed); default 16
       #define ROLN_PLAN    20, 4             steps of a plan, motors; default 0: NAME_plan_.. is not generated
       #define ROLN_ROWS    4000              rows of a step of Gauss-Newton; default 0: NAME_newton_.. is not generated
       #define ROLN_LEARN   networks          what it moves: networks, all behind the autoencoder, or everything; default networks
       #define ROLN_LOAD    0                 1: NAME_filter_tick estimates a constant force on z, too, such as of a payload, which
                                              the references of NAME_control may take up
       #define ROLN_STORE   int8              weights of the autoencoder in flash: full, half, int8; default full. half and int8
                                              predict and control; NAME_store makes them from a model trained with full
       #include "roln.h"

   For all models of a file, before the first header of roln (roln_spd.h, 1 configuration): ROLN_DOUBLE, ROLN_FN, ROLN_CODE,
   ROLN_FLASH, ROLN_SIMD.

   Letters: q, qd, qdd [N] joints and their derivatives in time; z, zd, zdd [n] latent coordinates, z = rho(q), q = phi(z);
   D = drho/dq [n][N], J = dphi/dz [N][n], D J = I; tau [N] forces on joints, tau_z [n] on z.

   Generated types, for ROLN_NAME NAME:

       NAME_params      all numbers of a model: scales, time step, range seen in training, weights
       NAME_state       q, qd of all N joints
       NAME_latent      z, zd of the n latent coordinates
       NAME_target      what a controller follows, z, zd, zdd, and how firmly, its gains kp, kd
       NAME_guard       what a guard remembers; in it tau, the torque that may go to the motors
       NAME_equation    M, c, g, d, T, V at a state
       NAME_jacobian    A, B of a step
       NAME_work        scratch of prediction and control; one for each thread and interrupt, see below
       NAME_linwork     scratch of NAME_linear
       NAME_lqrwork     scratch of NAME_lqr and NAME_lqr_along
       NAME_plan        with ROLN_PLAN: a plan, its states, torques and feedback
       NAME_planwork    ... scratch of NAME_plan_..
       NAME_filter      what a filter remembers; in it s, the estimate of z, zd
       NAME_filterwork  scratch of NAME_filter_tick
       NAME_train       scratch of training, of NAME_errors, NAME_fit_limits and NAME_fit_noise
       NAME_start       scratch of NAME_init, NAME_init_pod and NAME_chart_..; with small weights of NAME_store
       NAME_gradient    a gradient, the loss and the number of windows behind it
       NAME_optimiser   moments of the optimiser
       NAME_residuals   with ROLN_ROWS: rows and residuals of a step of Gauss-Newton
       NAME_newton      ... its sums, the step and where it ends
       NAME_chart       with ROLN_CHART: sums of NAME_chart_add
       NAME_turn        ... steps and scratch of NAME_chart_turn
       NAME_words       with small weights: what NAME_write writes

   Generated functions. One control tick:

       NAME_tick        NAME_encode, NAME_control, NAME_lift or NAME_allocate, and NAME_guard_tick in one call
       NAME_encode      q, qd -> z, zd
       NAME_decode      z, zd -> q, qd
       NAME_decode_some z, zd -> q, qd of a few joints
       NAME_aim         reference q, qd, qdd -> z, zd, zdd
       NAME_control     PD+ on the model: tau_z = M zdd_ref + C zd_ref + g + d - Kp e - Kd ed
       NAME_gains       gains of joints, Nm/rad and Nms/rad -> those of NAME_control
       NAME_lift        tau_z -> tau = D^T tau_z
       NAME_allocate    tau_z -> the few motors that come nearest, and what they cannot make of it
       NAME_guard_tick  lets a torque pass to the motors, clipped to limits, or holds the last one, or stops
       NAME_in_range    is a latent state within what training has seen?
       NAME_fit_limits  the limits of a guard, from recordings of good motion

   Prediction and mechanics:

       NAME_step        z, zd a step of dt seconds ahead under tau: M zdd + c + g + d = J^T tau
       NAME_linear      the same, with its derivatives A, B
       NAME_reduce      tau -> tau_z = J^T tau
       NAME_inverse     z, zd, zdd -> tau_z: inverse dynamics
       NAME_terms       M, c, g, d, kinetic and potential energy
       NAME_friction_of with ROLN_FRICTION: its levels c and the velocities v at which it sets in
       NAME_inertia     y = D^T M D v: the inertia that the joints feel

   Feedback, plans and estimates:

       NAME_lqr         feedback of least cost about a state, from weights of joints and motors
       NAME_lqr_along   the same along a reference, gains that vary with time
       NAME_plan_next   with ROLN_PLAN: the torques ahead that reach a goal at the least cost within the motors' limits
       NAME_plan_follow ... the torque now, with feedback
       NAME_plan_linear ... A, B, c along it, for other solvers
       NAME_filter_tick z, zd from positions alone: a Kalman filter on the model
       NAME_fit_noise   its noise, from recordings

   Training; all but NAME_errors and NAME_fit_range are of models with full weights:

       NAME_init_pod    scales and weights at the linear optimum (POD) of recorded motion
       NAME_init        random weights
       NAME_fit_inertia the unit of inertia, where forces are known
       NAME_variance    of the data of each loss term, to weigh the terms by
       NAME_grad_acc    adds the gradient of the acceleration loss
       NAME_grad        adds the gradient of the loss over windows of several steps
       NAME_update      one step of Riemannian Adam
       NAME_rows        residuals of chosen samples or windows, and their rows, for Gauss-Newton
       NAME_newton_rows   Riemannian Gauss-Newton: rows become tangents
       NAME_newton_sums   ... the sums of their products
       NAME_newton_step   ... the step, and where it ends
       NAME_newton_judge  ... is it taken? After the last refusal: roln_newton_over
       NAME_errors      roll-out errors
       NAME_fit_range   records the range of z, zd that the motion has seen

   A chart in closed form (ROLN_CHART, full weights): NAME_init_pod, or NAME_chart_center, then

       NAME_chart_turn   a step to a better encoder, on a few thousand samples
       NAME_chart_add    adds recorded motion, a sample at a time or all, to sums
       NAME_chart_merge  adds the sums of other recordings, or of another machine
       NAME_chart_solve  the decoder that fits them best
       NAME_chart_center coordinates in which the recorded range is -1 .. 1

   Keeping it:

       NAME_check       are the parameters in memory what they were? A few numbers a tick
       NAME_pack        parameters -> bytes
       NAME_unpack      bytes -> parameters
       NAME_foreign     are parameters of another ROLN_SLOPE or ROLN_LEAST?
       NAME_write       parameters -> C text for flash
       NAME_store       with small weights: bytes of the full model -> parameters

   Constants: NAME_N, NAME_n joints and latent coordinates; NAME_force_size numbers of a force: N, or inputs; NAME_theta_size
   trained parameters; NAME_numbers numbers of NAME_params; NAME_packed_size bytes of NAME_pack (NAME_full_packed_size: of the
   model with full weights); NAME_horizon; NAME_steps, NAME_motors of a plan. For the kernels: NAME_model, NAME_trained(p); for an
   optimiser of your own: NAME_table, NAME_blocks. ROLN_CHARTED: 1 if the model included last has a chart, else 0.

   One NAME_work per context: a main loop, a task or an interrupt each have scratch of their own. An interrupt that calls with the
   scratch of what it interrupts leaves wrong numbers there, with ROLN_OK.

   Statuses of all that evaluates the networks: ROLN_E_SHAPE, the parameters are of another ROLN_SLOPE or ROLN_LEAST, or were never
   set; ROLN_E_NOT_FINITE; ROLN_E_RANGE, eigenvalues of the mass matrix beyond e^+-40 or too far apart (roln_exp_range);
   ROLN_E_NOT_SPD, a base point or a mass matrix that is not positive definite to working precision; ROLN_E_NO_CONVERGENCE, of the
   eigensolver or of a midpoint step that is too long. Whatever fails leaves its outputs untouched.

   Sections:

   1 model and units           what is known of a model besides its numbers, and the units that its networks see
   2 a control tick            in the order in which a measurement meets it: encode, control, lift or allocate, guard
   3 prediction and mechanics  a step, its derivatives, inverse dynamics, the terms of the equation of motion
   4 Riccati equations         feedback of least cost for a linear system: by doubling, and step by step backward
   5 optimal control           of a linear system within limits: interior points on a Riccati recursion
   6 feedback and estimates    LQR, plans and a Kalman filter on the model
   7 a training sample         in the order in which it meets the gradient: gather, encode, roll out, decode, compare, back
   8 data, charts, errors      scales, variances, limits and noise from recordings; charts in closed form; roll-out errors
   9 packed parameters         bytes, checksums, C text for flash
   10 the typed shell          generated anew for every ROLN_NAME: the functions listed above

   Angles in q, any consistent units; z has none, zd is 1/s, M is J s^2, forces on z and energies are J. With ROLN_ANGLES z is q
   itself (scale.q = 1); sliders beside angles in a unit in which they move by about one, which ROLN_SCALE each finds by itself.
   Of an angle, z and q may be on any turn, up to 2^20 rad from 0, beyond which a function says ROLN_E_NOT_FINITE, as it does
   where two that it compares are farther apart: the networks see its cosine and sine, differences are those of the shorter way,
   within (-pi, pi], and it is always in range. NAME_step and NAME_linear keep its turn as far as two turns, 4 pi, from 0, and
   bring it within (-pi, pi] first where it is farther out: subtract angles by roln_wrap. */

#ifndef ROLN_H
#define ROLN_H

#include "roln_ae.h"
#include "roln_lnn.h"
#include "roln_riem.h"

/* ---- 1 model and units ------------------------------------------------------------------------ */

/* Linkage of the functions that take a trained model: inlined into those of the shell, where the model is a constant, so that the
   compiler leaves out what it does not use: a quarter of the code. A program that knows its models at run time only, and calls
   these functions itself, defines ROLN_INLINE as ROLN_FN. */
#ifndef ROLN_INLINE
#define ROLN_INLINE ROLNI_INLINE
#endif

/* Everything about a model but its numbers; constant, generated by the shell. */
typedef struct {
    roln_ae ae;
    roln_lnn lnn;
    int scheme; /* ROLN_EULER, ROLN_RK4, ROLN_MIDPOINT */
    int inputs; /* 0: models get the force tau [N]; else u [inputs] with a learned constant input map, tau = B u */
    int own;    /* 1: each joint has a unit of its own, roln_trained.each */
} roln_model;

/* Number of parameters theta: of the autoencoder, the Lagrangian network and, with inputs, B [N][inputs]. */
ROLN_FN int roln_params(const roln_model *md)
{
    return roln_ae_params(&md->ae) + roln_lnn_params(&md->lnn) + md->ae.size[0] * md->inputs;
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

/* A trained model: its description, and where its numbers are. */
typedef struct {
    const roln_model *model;
    const roln_scale *scale;
    const roln_real *z_min, *z_max, *zd_max; /* [n] range seen in training */
    const roln_real *theta;                  /* [roln_params] */
    const roln_real *each;                   /* [N] of a model with own units; NULL: all are 1 */
} roln_trained;

/* The joints' own units, NULL: all are 1. md is m->model, loaded before m was seen by other functions: where it is a constant
   without own units, nothing is left of what is done with them. */
ROLN_INLINE const roln_real *rolni_each(const roln_model *md, const roln_trained *m)
{
    return md->own ? m->each : NULL;
}

/* The same for forces: a learned input map B has the units in it, force on x = B u. */
ROLN_INLINE const roln_real *rolni_each_force(const roln_model *md, const roln_trained *m)
{
    return md->inputs > 0 ? NULL : rolni_each(md, m);
}

/* Nonzero if those of angles are 1. */
ROLN_INLINE int rolni_each_turns(const roln_model *md, const roln_real *each)
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

/* The parameters of the Lagrangian network among those of a model. */
ROLN_INLINE const roln_real *rolni_net(const roln_trained *m)
{
    return m->theta + roln_ae_params(&m->model->ae);
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

/* The sizes that macros ask S for, S(N), S(n), .., are those of roln_ae.h and roln_lnn.h, the members of roln_model, force_size,
   and works that several ask for (10, ROLN_PARTS). */

/* The force on the joints, in units of the networks, [nb][N] of nb forces `in` [nb][roln_force_size]: in itself or, with inputs,
   B in, which is written to x. Returns where it is. */
ROLN_INLINE const roln_real *rolni_tau(const roln_trained *m, int nb, const roln_real *in, roln_real *x)
{
    const roln_model *md = m->model;
    const int N = md->ae.size[0];
    if (md->inputs == 0) return in;
    roln_mm_bt(nb, md->inputs, N, in, m->theta + roln_params(md) - N * md->inputs, x);
    return x;
}
#define ROLNI_TAU(S, nb) ((S(inputs) > 0) * (nb) * S(N)) /* numbers of x that rolni_tau writes */

/* ---- 2 a control tick ------------------------------------------------------------------------- */

/* Measured q, qd become z, zd (roln_encode), these a torque tau_z in the latent space (roln_control, in it roln_inverse), that a
   torque tau on the joints (roln_lift), which a guard lets pass or not (roln_guard_tick). roln_tick is all of it. Scratch of each
   is a list of arrays, NAME_MEM; how such lists work: roln_spd.h, 1. */

/* (z, zd) = (rho(q), D qd) and zdd = D qdd + (dD/dt) qd: the 2-jet that a reference for control needs.
   q, qd, qdd [N] in (qdd NULL: zdd = 0); z, zd, zdd [n] (zdd may be NULL) out, untouched on ROLN_E_NOT_FINITE.
   work [ROLN_ENCODE_WORK], jets = 3 with qdd, else 2. */
#define ROLN_ENCODE_MEM(X, S, jets) X(s, (jets) * S(n)) X(tape, ROLN_AE_ENCODE_REST(S, jets, 1)) X(x, (jets) * S(N))
#define ROLN_ENCODE_WORK(S, jets) (0 ROLN_ENCODE_MEM(ROLNI_SIZE, S, jets))
ROLN_INLINE roln_status roln_encode(const roln_trained *m, const roln_real *q, const roln_real *qd, const roln_real *qdd,
                                    roln_real *z, roln_real *zd, roln_real *zdd, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const roln_real unit = m->scale->q;
    const int N = ae->size[0], n = m->model->lnn.n, N1 = roln_ae_size(ae, 1), ae_sum = roln_ae_sum(ae), jets = qdd ? 3 : 2;
    ROLN_ENCODE_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets)
    int i;
    for (i = 0; i < N; i++) {
        x[i] = q[i] / unit;
        x[N + i] = qd[i] / unit;
        if (qdd) x[2 * N + i] = qdd[i] / unit;
    }
    rolni_divide_each(jets, N, rolni_each(m->model, m), x);
    roln_ae_encode(ae, jets, 1, m->theta, x, s, tape); /* x is the end of tape */
    if (!roln_all_finite(jets * n, s)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, s, z);
    rolni_copy(n, s + n, zd);
    if (zdd && qdd) rolni_copy(n, s + 2 * n, zdd);
    else if (zdd) rolni_zero(n, zdd);
    return ROLN_OK;
}

/* x = [phi(z); J(z) zd] [2N] and the tape of the decoder (2-jets). ROLN_E_NOT_FINITE if x is not finite. work [2n]. */
ROLN_INLINE roln_status rolni_decode(const roln_trained *m, const roln_real *z, const roln_real *zd, roln_real *x, roln_real *tape,
                                     roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n;
    int i;
    rolni_copy(n, z, work);
    rolni_copy(n, zd, work + n);
    roln_ae_decode(ae, 2, 1, m->theta, work, x, tape);
    for (i = 0; i < 2 * N; i++)
        x[i] *= m->scale->q;
    rolni_multiply_each(2, N, rolni_each(m->model, m), x);
    return roln_all_finite(2 * N, x) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* q = phi(z), qd = J(z) zd. z, zd [n] in; q, qd [N] out, untouched on ROLN_E_NOT_FINITE. work [ROLN_DECODE_WORK]. */
#define ROLN_DECODE_MEM(X, S) X(x, 2 * S(N)) X(s, 2 * S(n))
#define ROLN_DECODE_WORK(S) (0 ROLN_DECODE_MEM(ROLNI_SIZE, S) + ROLN_AE_DECODE_TAPE(S, 2, 1))
ROLN_INLINE roln_status roln_decode(const roln_trained *m, const roln_real *z, const roln_real *zd, roln_real *q, roln_real *qd,
                                    roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    ROLN_DECODE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    const roln_status st = rolni_decode(m, z, zd, x, work, s);
    if (st != ROLN_OK) return st;
    rolni_copy(N, x, q);
    rolni_copy(N, x + N, qd);
    return ROLN_OK;
}

/* The count joints which[] of roln_decode alone, the same bits: q, qd [count] out. ROLN_E_LENGTH: count beyond 0 .. N, or a joint
   beyond 0 .. N-1; ROLN_E_NOT_FINITE. Then q, qd are untouched. The outermost layer costs n count instead of n N multiply-adds; if
   it is bent, as much as all joints (roln_ae_decode_some).
   work [ROLN_DECODE_SOME_WORK]: the most, for count = N. */
#define ROLN_DECODE_SOME_MEM(X, S, count) X(s, 2 * S(n)) X(x, 2 * (count))
#define ROLN_DECODE_SOME_WORK(S) (0 ROLN_DECODE_SOME_MEM(ROLNI_SIZE, S, S(N)) + ROLN_AE_DECODE_SOME_TAPE(S, 2, 1))
ROLN_INLINE roln_status roln_decode_some(const roln_trained *m, const roln_real *z, const roln_real *zd, int count,
                                         const int *which, roln_real *q, roln_real *qd, roln_real *work)
{
    const roln_real *each = rolni_each(m->model, m);
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    int i;
    if (count < 0 || count > N) return ROLN_E_LENGTH;
    for (i = 0; i < count; i++)
        if (which[i] < 0 || which[i] >= N) return ROLN_E_LENGTH;
    {
        ROLN_DECODE_SOME_MEM(ROLNI_CARVE, ROLNI_LOCAL, count)
        rolni_copy(n, z, s);
        rolni_copy(n, zd, s + n);
        roln_ae_decode_some(&m->model->ae, 2, 1, count, m->theta, which, s, x, work);
        for (i = 0; i < 2 * count; i++)
            x[i] *= m->scale->q;
        for (i = 0; each && i < count; i++)
            x[i] *= each[which[i]], x[count + i] *= each[which[i]];
        if (!roln_all_finite(2 * count, x)) return ROLN_E_NOT_FINITE;
        rolni_copy(count, x, q);
        rolni_copy(count, x + count, qd);
    }
    return ROLN_OK;
}

/* Angles of z [nb][n] that are more than two turns from 0 come back within (-pi, pi]: farther out a step of a millisecond would be
   lost in their rounding. NaN beyond 2^20. */
ROLN_INLINE void rolni_turn_back(const roln_lnn *f, int nb, roln_real *z)
{
    int i;
    for (i = 0; i < nb * f->n; i++)
        if (roln_lnn_angle(f, i % f->n) && ROLN_ABS(z[i]) > 4 * ROLNI_PI) z[i] = roln_wrap(z[i]);
}

/* The state of the network in its own unit of time: s = [z; zd t]. */
ROLN_INLINE void rolni_state(const roln_trained *m, const roln_real *z, const roln_real *zd, roln_real *s)
{
    const int n = m->model->lnn.n;
    int i;
    for (i = 0; i < n; i++) {
        s[i] = z[i];
        s[n + i] = zd[i] * m->scale->t;
    }
}

/* The energy T + V at a state, and zd^T d, the power lost in it: what limits.power of the guard is about. */
typedef struct {
    roln_real energy, lost;
} rolni_balance;

/* From the tape of the Lagrangian network at z, zd. work [2n]. */
ROLN_INLINE rolni_balance rolni_balance_of(const roln_trained *m, const rolni_tape *t, const roln_real *zd, roln_real *work)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int n = lnn->n;
    const roln_real f = m->scale->m / (m->scale->t * m->scale->t);
    rolni_balance b;
    int i;
    rolni_mul(lnn, t, 0, t->zd, work, work + n);
    b.energy = roln_dot(n, t->zd, work) / 2 * f + t->v[0] * f;
    for (i = 0; i < n; i++)
        work[i] = t->d[i] * f;
    b.lost = roln_dot(n, zd, work);
    return b;
}

/* roln_inverse, and to b the energy balance at (z, zd); b NULL: not wanted. work [ROLN_INVERSE_WORK]. */
#define ROLN_INVERSE_MEM(X, S, tape_size) X(s, 2 * S(n)) X(a, S(n)) X(v, S(n)) X(tape, tape_size)
#define ROLN_INVERSE_WORK(S) (0 ROLN_INVERSE_MEM(ROLNI_SIZE, S, ROLN_LNN_TAPE(S, 2, 0, 1)) + ROLN_LNN_INVERSE_WORK(S, 2, 0, 1))
ROLN_INLINE roln_status rolni_inverse(const roln_trained *m, const roln_real *z, const roln_real *zd, const roln_real *w,
                                      const roln_real *zdd, roln_real *tau_z, rolni_balance *b, roln_real *work)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int n = lnn->n;
    const roln_real ts = m->scale->t, t2 = ts * ts, unit = m->scale->m;
    ROLN_INVERSE_MEM(ROLNI_CARVE, ROLNI_LOCAL, roln_lnn_tape(lnn, 2, 0, 1))
    roln_status st;
    int i;
    rolni_state(m, z, zd, s);
    for (i = 0; i < n; i++) {
        a[i] = zdd[i] * t2;
        v[i] = w ? w[i] * ts : 0;
    }
    st = roln_lnn_inverse(lnn, 0, 1, rolni_net(m), s, w ? v : NULL, a, a, tape, work);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        a[i] = a[i] / t2 * unit;
    if (!roln_all_finite(n, a)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, a, tau_z);
    if (b) {
        const rolni_tape t = rolni_tape_of(lnn, w ? 2 : 1, 0, 1, tape); /* unreached: a balance is asked for with w only */
        *b = rolni_balance_of(m, &t, zd, work);
    }
    return ROLN_OK;
}

/* Inverse dynamics tau_z = M zdd + C(z, zd) w + g + d [n] (roln_lnn_inverse); w NULL: zd. tau_z is untouched unless ROLN_OK.
   Status of roln_lnn_inverse, ROLN_E_NOT_FINITE. work [ROLN_INVERSE_WORK]. */
ROLN_INLINE roln_status roln_inverse(const roln_trained *m, const roln_real *z, const roln_real *zd, const roln_real *w,
                                     const roln_real *zdd, roln_real *tau_z, roln_real *work)
{
    return rolni_inverse(m, z, zd, w, zdd, tau_z, NULL, work);
}

/* What a controller follows and how firmly: the reference z, zd, zdd [n], the diagonals of the gains Kp, Kd: kp [J],
   kd [J s] [n]; and the load [J] [n] that it works against, of a filter, NULL: none. */
typedef struct {
    const roln_real *z, *zd, *zdd, *kp, *kd;
    const roln_real *load;
} roln_target;

/* roln_control, and to b the energy balance at (z, zd), the power of the load among what is lost; b NULL: not wanted. */
#define ROLN_CONTROL_MEM(X, S) X(out, S(n))
#define ROLN_CONTROL_WORK(S) (0 ROLN_CONTROL_MEM(ROLNI_SIZE, S) + ROLN_INVERSE_WORK(S))
ROLN_INLINE roln_status rolni_control(const roln_trained *m, const roln_real *z, const roln_real *zd, const roln_target *ref,
                                      roln_real *tau_z, rolni_balance *b, roln_real *work)
{
    const int n = m->model->lnn.n;
    ROLN_CONTROL_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    const roln_status st = rolni_inverse(m, z, zd, ref->zd, ref->zdd, out, b, work);
    int i;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        out[i] -= ref->kp[i] * (z[i] - roln_lnn_near(&m->model->lnn, i, z[i], ref->z[i])) + ref->kd[i] * (zd[i] - ref->zd[i]);
    for (i = 0; i < n && ref->load; i++)
        out[i] -= ref->load[i];
    if (b && ref->load) b->lost -= roln_dot(n, zd, ref->load); /* a force that is known does not unbalance the guard */
    if (!roln_all_finite(n, out)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, out, tau_z);
    return ROLN_OK;
}

/* PD+ control in the latent space (Paden and Panja 1988 on the reduced model; Friedl et al. 2026): with e = z - z_ref,
       tau_z = M(z) zdd_ref + C(z, zd) zd_ref + g(z) + R(z) zd - Kp e - Kd ed - load,   e of angles by the shorter way,
   W = 1/2 ed^T M ed + 1/2 e^T Kp e then falls as dW/dt = -ed^T Kd ed, as far as the model is true. z, zd, ref in; tau_z [n] out,
   untouched unless ROLN_OK. Then roln_lift, or roln_allocate where there are fewer motors. Status of roln_lnn_terms,
   ROLN_E_NOT_FINITE. work [ROLN_CONTROL_WORK]. */
ROLN_INLINE roln_status roln_control(const roln_trained *m, const roln_real *z, const roln_real *zd, const roln_target *ref,
                                     roln_real *tau_z, roln_real *work)
{
    return rolni_control(m, z, zd, ref, tau_z, NULL, work);
}

/* Gains of roln_control from gains of the joints, Kp [N] in Nm/rad, Kd [N] in Nms/rad: the work that a spring at each joint does
   is the same, dq^T Kp dq = dz^T (J^T Kp J) dz, of which kp takes the diagonal, and kd that of J^T Kd J:
       kp_j = sum_i Kp_i J_ij^2,   kd_j = sum_i Kd_i J_ij^2,   J = dphi/dz at z
   What couples coordinates is left out; of modes of motion (docs/control.md) it is small. z [n] in; kp, kd [n] out, untouched on
   ROLN_E_NOT_FINITE. Cost n roln_decode. work [ROLN_GAINS_WORK]. */
#define ROLN_GAINS_MEM(X, S) X(out, 2 * S(n)) X(e, S(n)) X(x, 2 * S(N)) X(s, 2 * S(n))
#define ROLN_GAINS_WORK(S) (0 ROLN_GAINS_MEM(ROLNI_SIZE, S) + ROLN_AE_DECODE_TAPE(S, 2, 1))
ROLN_INLINE roln_status roln_gains(const roln_trained *m, const roln_real *z, const roln_real *Kp, const roln_real *Kd,
                                   roln_real *kp, roln_real *kd, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    ROLN_GAINS_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    int i, j;
    rolni_zero(2 * n, out);
    for (j = 0; j < n; j++) {
        roln_status st;
        for (i = 0; i < n; i++)
            e[i] = i == j;
        if ((st = rolni_decode(m, z, e, x, work, s)) != ROLN_OK) return st;
        for (i = 0; i < N; i++) {
            out[j] += Kp[i] * (x[N + i] * x[N + i]);
            out[n + j] += Kd[i] * (x[N + i] * x[N + i]);
        }
    }
    if (!roln_all_finite(2 * n, out)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, out, kp);
    rolni_copy(n, out + n, kd);
    return ROLN_OK;
}

/* roln_lift behind the decoder: tape of the decoder, 2-jets (jets = 2) or positions (1), in; it is spent. tau is written in any
   case. work [ROLN_AE_LIFT_WORK(S, 1)]. */
ROLN_INLINE roln_status rolni_lift(const roln_trained *m, int jets, roln_real *tape, const roln_real *tau_z, roln_real *tau,
                                   roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0];
    int i;
    roln_ae_lift_tape(ae, jets, 1, tape, tape);
    roln_ae_lift(ae, 1, m->theta, tape, tau_z, tau, work);
    for (i = 0; i < N; i++)
        tau[i] /= m->scale->q;
    rolni_divide_each(1, N, rolni_each(m->model, m), tau);
    return roln_all_finite(N, tau) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* tau = D(phi(z))^T tau_z [N]: the force on q that acts on z as tau_z, J^T tau = tau_z. ROLN_E_NOT_FINITE leaves tau
   untouched. work [ROLN_LIFT_WORK]. */
#define ROLN_LIFT_MEM(X, S) X(tape, ROLN_AE_DECODE_TAPE(S, 1, 1)) X(out, S(N))
#define ROLN_LIFT_WORK(S) (0 ROLN_LIFT_MEM(ROLNI_SIZE, S) + ROLN_AE_LIFT_WORK(S, 1))
ROLN_INLINE roln_status roln_lift(const roln_trained *m, const roln_real *z, const roln_real *tau_z, roln_real *tau,
                                  roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], ae_sum = roln_ae_sum(ae), curves = ae->curves;
    ROLN_LIFT_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_status st;
    if (!roln_all_finite(m->model->lnn.n, z)) return ROLN_E_NOT_FINITE;
    roln_ae_decode(ae, 1, 1, m->theta, z, NULL, tape);
    st = rolni_lift(m, 1, tape, tau_z, out, work);
    if (st == ROLN_OK) rolni_copy(N, out, tau);
    return st;
}

/* Where motors act, tau = B u. */
typedef struct {
    int count;
    const roln_real *B; /* [N][count]; NULL: the map that a model with inputs has learned, count is then its inputs */
    roln_real mu;       /* damping of roln_allocate; a hundredth of the largest number of J^T B is usual */
} roln_motors;

/* The same with B and count in their places; NULL: the learned ones. B NULL: there are none. */
ROLN_INLINE roln_motors rolni_motors(const roln_trained *m, const roln_motors *motors)
{
    const roln_model *md = m->model;
    roln_motors f = {0, NULL, 0};
    if (motors) f = *motors;
    if (!f.B) f.count = md->inputs;
    if (!f.B && md->inputs > 0) f.B = m->theta + roln_params(md) - md->ae.size[0] * md->inputs;
    return f;
}

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
ROLN_FN roln_real rolni_missed(int n, const roln_real *x, const roln_real *y, roln_real mu)
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

/* 1 if no pivot of the triangle R [n][n] of count rows is one of rounding errors. */
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

/* Motors u [count] for a reduced force, tau = B u: damped least squares (Levenberg-Marquardt),
       u = arg min |G u - tau_z|^2 + mu^2 |u|^2 = G^T y,   y = (G G^T + mu^2 I)^-1 tau_z,   G = J(z)^T B.
   z, tau_z [n], motors in; u out, and missed [1] (may be NULL): how much of tau_z they do not make, as a part of it,
       |tau_z - G u| / |tau_z| = mu^2 |y| / |tau_z|,   0 if tau_z is 0
   both untouched unless ROLN_OK. ROLN_E_LENGTH: no motors. ROLN_E_NOT_SPD: they do not span z, to within rounding, and mu does not
   make up for it. ROLN_E_NOT_FINITE: z, G or y is not. Nothing is squared: y = R^-1 R^-T tau_z with R the triangle of
   [mu I; G^T]. What is left of tau_z gives a correction of y, and a second one where motors are nearly parallel, which leaves a
   hundredth at most (test_control.c: test_near_motors). Cost 3 count roln_reduce, 5 where motors are nearly parallel.
   work [ROLN_ALLOCATE_WORK]. */
#define ROLN_ALLOCATE_MEM(X, S) \
    X(tape, ROLN_AE_DECODE_TAPE(S, 1, 1)) X(x, S(N)) X(g, S(n)) X(y, 3 * S(n)) X(rest, S(n)) X(R, (S(n) + 1) * S(n))
#define ROLN_ALLOCATE_WORK(S) \
    (0 ROLN_ALLOCATE_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLN_AE_REDUCE_WORK(S, 1), ROLN_TRIANGLE_WORK(S(n) + 1, S(n))))
ROLN_INLINE roln_status roln_allocate(const roln_trained *m, const roln_real *z, const roln_motors *motors, const roln_real *tau_z,
                                      roln_real *u, roln_real *missed, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n, ae_sum = roln_ae_sum(ae), curves = ae->curves;
    const roln_motors f = rolni_motors(m, motors);
    ROLN_ALLOCATE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    int last = 4, parts = 0, pass, j, i;
    if (f.count < 1) return ROLN_E_LENGTH;
    if (!roln_all_finite(n, z)) return ROLN_E_NOT_FINITE;
    rolni_zero(n * n, R);
    for (i = 0; i < n; i++)
        R[i * (n + 1)] = f.mu;
    roln_ae_decode(ae, 1, 1, m->theta, z, NULL, tape);
    for (pass = 0; pass <= last; pass++) { /* 0: R, then y; 1 .. last - 1: what is left of tau_z; last: u */
        rolni_copy(n, tau_z, rest);
        for (j = 0; j < f.count; j++) {
            roln_real torque = 0;
            for (i = 0; i < N; i++)
                x[i] = f.B[i * f.count + j] * m->scale->q;
            rolni_multiply_each(1, N, rolni_each_force(m->model, m), x);
            roln_ae_reduce(ae, 1, m->theta, tape, x, g, work);
            for (i = 0; i < parts; i++)
                torque += roln_dot(n, g, y + i * n);
            if (pass == 0) rolni_copy(n, g, R + n * n), roln_triangle(n + 1, n, R, work);
            else if (pass == last) u[j] = torque;
            else if (!roln_finite(torque)) return ROLN_E_NOT_FINITE; /* unreached: where it overflows, y does */
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
    for (i = n; i < parts * n; i++)
        y[i % n] += y[i];
    if (missed) *missed = rolni_missed(n, tau_z, y, f.mu);
    return ROLN_OK;
}

/* What stands between a model and a motor. Bits of a fault word, unsigned: they may be or-ed with bits of a filter and with yours.
   They are no enumerators, because C++26 refuses to or those of two enumerations. */
#define ROLN_FAULT_INPUT 1u       /* q, qd, dt, a limit or the motors are not usable numbers. */
#define ROLN_FAULT_STATUS 2u      /* A function on the way returned a status other than ROLN_OK. */
#define ROLN_FAULT_OUTPUT 4u      /* A torque is NaN or infinite. */
#define ROLN_FAULT_LIMIT 8u       /* A torque is beyond a limit of torque or rate, and limits.strict is 1. */
#define ROLN_FAULT_RANGE 16u      /* z or zd is outside the range of the training data, widened by limits.margin. */
#define ROLN_FAULT_ENERGY 32u     /* |dE/dt - zd^T (J^T tau - d)| is beyond limits.power. */
#define ROLN_FAULT_EXPIRED 64u    /* More than limits.hold ticks in a row were bad. Torques are safe until the guard is zeroed. */
#define ROLN_FAULT_MANIFOLD 128u  /* q or qd is farther than limits.q_off or limits.qd_off from what the model can represent. */
#define ROLN_CLIPPED 256u         /* A torque was clipped to a limit of torque or rate. This is no fault. */

typedef struct {
    roln_real dt;     /* time from tick to tick, s */
    roln_real margin; /* of the range, as a part of its width */
    roln_real power;  /* largest energy-rate residual, W (in the unit of the model's energy, if its forces had none); 0: no check */
    roln_real tau;    /* largest torque of each joint (or input) */
    int hold;         /* bad ticks in a row for which the last good torque is held */
    roln_real q_off;  /* largest |q - phi(z)| of a joint, what z does not see of q; 0: no check */
    roln_real qd_off; /* largest |qd - J zd| of a joint; 0: no check */
    /* what follows may be left out */
    int window;       /* ticks over which the residual is averaged before it is compared with power; 0, 1: each by itself; more than
                         1 / (64 ROLN_EPS), 131072 as float, count as that: a longer mean would stand still in its rounding */
    int strict;       /* 1: a torque beyond a limit of torque or rate is a fault; 0: it is clipped */
    roln_real rate;   /* largest change of each joint's torque in a second; 0: no bound */
    const roln_real *tau_each, *rate_each; /* [torques] in place of tau, of rate; NULL: these */
    const roln_real *safe; /* [torques] once the guard has expired, read in every tick; NULL: 0 */
    const roln_motors *motors; /* where they act, and torques are theirs; NULL: at each joint, or the learned inputs */
} roln_limits; /* torques: the count of motors with a B, else roln_force_size */

/* State of a guard, beside the torque of the last tick. Zero-initialised: a fresh start. */
typedef struct {
    uint32_t faults; /* sticky: the faults of all ticks so far */
    int bad;         /* bad ticks in a row; -1: expired, as faults says, too */
    int known;       /* 1: energy and power are those of the last tick */
    roln_real energy, power;
    roln_real residual; /* of the energy rate, W, averaged over limits.window */
    roln_real missed;   /* of the last tau_z that motors had to make, the part that they could not (roln_allocate) */
} roln_guard;

/* Measured q, qd [N]. */
typedef struct {
    const roln_real *q, *qd;
} roln_measured;

/* A guard, and the torque that it holds, with room for roln_force_size: of the last tick when a tick begins, the one for the motors
   when it ends. */
typedef struct {
    roln_guard *guard;
    roln_real *tau;
} roln_held;

/* Nonzero if z, zd [n] lie in the range [z_min - margin (z_max - z_min), ..], |zd| <= (1 + margin) zd_max; NaN does not. An
   angle does, whatever its range, up to 2^20. */
ROLN_INLINE int roln_in_range(const roln_trained *m, roln_real margin, const roln_real *z, const roln_real *zd)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int n = lnn->n;
    int i, in = 1;
    for (i = 0; i < n; i++) {
        const roln_real wide = margin * (m->z_max[i] - m->z_min[i]);
        const int known = roln_lnn_angle(lnn, i) ? rolni_is_angle(z[i]) : z[i] >= m->z_min[i] - wide && z[i] <= m->z_max[i] + wide;
        in &= roln_finite(z[i]) && roln_finite(zd[i]) && known;
        in &= ROLN_ABS(zd[i]) <= (1 + margin) * m->zd_max[i];
    }
    return in;
}

/* Nonzero if the limits of nu torques make sense: finite, none negative, dt positive. */
ROLN_FN int rolni_limits_valid(const roln_limits *limits, int nu)
{
    const roln_real bound[7] = {limits->dt,    limits->margin, limits->power, limits->tau,
                                limits->q_off, limits->qd_off, limits->rate};
    const roln_real *const each[2] = {limits->tau_each, limits->rate_each};
    int i, k, valid = roln_all_finite(7, bound) && limits->dt > 0 && limits->hold >= 0 && limits->window >= 0;
    for (i = 1; i < 7; i++)
        valid &= bound[i] >= 0;
    for (k = 0; k < 2; k++)
        for (i = 0; each[k] && i < nu; i++)
            valid &= roln_finite(each[k][i]) && each[k][i] >= 0;
    return valid;
}

/* Nonzero if it is known how many motors there are: they are learned, or at most N at a model's joints. */
ROLN_FN int rolni_motors_counted(const roln_model *md, const roln_motors *motors)
{
    if (!motors) return 1;
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

/* The torque of joint i after `last`, which is within its limit, that comes nearest to want. */
ROLN_FN roln_real rolni_clip(const roln_limits *limits, int i, roln_real last, roln_real want)
{
    const roln_real top = rolni_most(limits, i), rate = rolni_rate(limits, i);
    roln_real low = -top, high = top;
    if (rate > 0) {
        const roln_real step = rate * limits->dt, down = last - step, up = last + step; /* what is compared is what is taken */
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

/* What a guard judges: the measured q, qd [N], their latent state z, zd [n], NULL if the encoder failed, the state decoded, x [2N]
   = [phi(z); J zd], and the balance there, NULL if it is not known. x and the balance are read where a limit asks for them. */
typedef struct {
    const roln_real *q, *qd, *z, *zd, *x;
    const rolni_balance *balance;
} rolni_seen;

/* Nonzero if a limit asks for the decoded state. */
ROLN_FN int rolni_limits_decode(const roln_limits *limits)
{
    return limits->q_off > 0 || limits->qd_off > 0 || limits->power > 0;
}

/* The faults of a tick but for energy and expiry, and ROLN_CLIPPED; tau: torque of the last tick. */
ROLN_INLINE uint32_t rolni_faults(const roln_trained *m, const roln_limits *limits, const rolni_seen *seen, const roln_real *want,
                                  const roln_real *tau)
{
    const int N = m->model->ae.size[0], nu = rolni_torques(m->model, limits->motors);
    uint32_t faults = 0;
    int i;
    if (!roln_all_finite(N, seen->q) || !roln_all_finite(N, seen->qd)) faults |= ROLN_FAULT_INPUT;
    if (!rolni_limits_valid(limits, nu) || !rolni_motors_valid(m->model, limits->motors)) faults |= ROLN_FAULT_INPUT;
    if (!want || !seen->z) faults |= ROLN_FAULT_STATUS;
    if (want && !roln_all_finite(nu, want)) faults |= ROLN_FAULT_OUTPUT;
    for (i = 0; want && !(faults & (ROLN_FAULT_OUTPUT | ROLN_FAULT_INPUT)) && i < nu; i++) {
        const roln_real most = rolni_clip(limits, i, rolni_last(limits, i, tau[i]), want[i]);
        if (most < want[i] || most > want[i]) faults |= limits->strict ? ROLN_FAULT_LIMIT : ROLN_CLIPPED;
    }
    if (!seen->z) return faults;
    if (rolni_limits_decode(limits) && !(faults & ROLN_FAULT_INPUT)) {
        if (!roln_all_finite(2 * N, seen->x)) faults |= ROLN_FAULT_STATUS;
        else if (!(m->model->lnn.angles ? rolni_near_turned(&m->model->lnn, seen->q, seen->x, limits->q_off)
                                        : rolni_all_within(N, seen->q, seen->x, limits->q_off)) ||
                 !rolni_all_within(N, seen->qd, seen->x + N, limits->qd_off))
            faults |= ROLN_FAULT_MANIFOLD;
    }
    if (!roln_in_range(m, limits->margin, seen->z, seen->zd)) faults |= ROLN_FAULT_RANGE;
    return faults;
}

/* Power qd^T tau of a force in [roln_force_size], or of motors, qd [N] in. work [ROLNI_TAU(S, 1)]. */
ROLN_INLINE roln_real rolni_power(const roln_trained *m, const roln_motors *motors, const roln_real *in, const roln_real *qd,
                                  roln_real *work)
{
    const int N = m->model->ae.size[0], own = m->model->own && m->model->inputs > 0;
    roln_real power = 0;
    int i;
    if ((!motors || !motors->B) && own) {
        (void)rolni_tau(m, 1, in, work);
        rolni_divide_each(1, N, m->each, work);
        return roln_dot(N, work, qd);
    }
    if (!motors || !motors->B) return roln_dot(N, rolni_tau(m, 1, in, work), qd);
    for (i = 0; i < N; i++)
        power += qd[i] * roln_dot(motors->count, motors->B + i * motors->count, in);
    return power;
}

/* The energy residual of a tick, W: the rate at which energy was gained since the last one, beyond the mean power of its ends;
   before: the power at its end, under the torque of the last tick. Its mean over limits->window is kept in g. Nonzero if that is
   too large. */
ROLN_FN int rolni_unbalanced(const roln_limits *limits, const rolni_balance *b, roln_real before, roln_guard *g)
{
    const roln_real window = ROLN_MIN(ROLNI_AS(roln_real, limits->window), 1 / (64 * ROLN_EPS));
    roln_real r = (b->energy - g->energy) / limits->dt - (before + g->power) / 2;
    if (window > 1) r = g->residual + (r - g->residual) / window;
    g->residual = roln_finite(r) ? r : 0;
    return !(ROLN_ABS(r) <= limits->power);
}

/* Limits where motors are not counted: arrays of limits are as long as nobody knows, and no torque but 0 is within those. */
ROLN_FN roln_limits rolni_limits_uncounted(const roln_limits *limits)
{
    roln_limits l = *limits;
    if (l.tau_each) l.tau = 0;
    l.tau_each = l.rate_each = l.safe = NULL, l.motors = NULL;
    return l;
}

/* roln_guard_tick on what was seen. */
ROLN_INLINE uint32_t rolni_guard(const roln_trained *m, const roln_limits *limits, const rolni_seen *seen, const roln_real *want,
                                 const roln_held *held, roln_real *work)
{
    const roln_motors *motors = limits->motors;
    const int counted = rolni_motors_counted(m->model, motors);
    const int nu = counted ? rolni_torques(m->model, motors) : roln_force_size(m->model);
    const roln_real *qd = seen->x + m->model->ae.size[0];
    const rolni_balance *b = seen->balance;
    roln_guard *g = held->guard;
    roln_real *tau = held->tau;
    roln_limits own;
    uint32_t faults = g->faults & ROLN_FAULT_EXPIRED, bad;
    int i, known = 0;
    if (g->bad < 0) faults |= ROLN_FAULT_EXPIRED; /* it stands there twice: no single bit that flips lets the motors go on */
    if (!counted) own = rolni_limits_uncounted(limits), limits = &own, want = NULL, faults |= ROLN_FAULT_INPUT;
    faults |= rolni_faults(m, limits, seen, want, tau);
    if (limits->power > 0 && !(faults & (ROLN_FAULT_INPUT | ROLN_FAULT_STATUS | ROLN_FAULT_RANGE))) {
        /* at the end of the last tick, under its torque */
        const roln_real before = b ? rolni_power(m, motors, tau, qd, work) - b->lost : 0;
        known = b && roln_finite(b->energy) && roln_finite(before);
        if (!known) faults |= ROLN_FAULT_STATUS;
        else if (g->known && rolni_unbalanced(limits, b, before, g)) faults |= ROLN_FAULT_ENERGY;
    }
    bad = faults & ~ROLNI_AS(uint32_t, ROLN_CLIPPED);
    if (bad) faults = bad; /* what was wanted does not reach the motors */
    if (bad && g->bad >= limits->hold) faults |= ROLN_FAULT_EXPIRED;
    g->bad = faults & ROLN_FAULT_EXPIRED ? -1 : bad ? g->bad + 1 : 0;
    for (i = 0; i < nu; i++) { /* want is there, unless bad */
        const roln_real last = rolni_last(limits, i, tau[i]);
        tau[i] = !bad ? rolni_clip(limits, i, last, want[i]) : faults & ROLN_FAULT_EXPIRED ? rolni_safe(limits, i) : last;
    }
    g->known = 0;
    if (known) { /* start of the next tick, under the new torque */
        const roln_real after = rolni_power(m, motors, tau, qd, work) - b->lost;
        if (roln_finite(after)) g->known = 1, g->energy = b->energy, g->power = after;
    }
    g->faults |= faults;
    return faults;
}

/* One tick of the guard, after the controller. x is what was measured, z, zd [n] its latent state, both NULL if the encoder failed;
   want [torques] what is to be applied from now on, NULL if a function on the way to it returned a status other than ROLN_OK; where
   motors are not those of a model it is not read, and no array of the limits. held->tau is the torque of the last tick in and that
   of this tick out: if nothing is wrong want, each joint clipped to its limits of torque and of rate (ROLN_CLIPPED); else the last
   one, at most limits->hold times in a row; then, until the guard is zeroed, the safe one, at once. A last torque that is beyond
   its limit counts as 0: a limit that falls has to fall no faster than the rate. Returns the faults of this tick, which are also
   added to held->guard->faults.
   The energy residual compares the energy gained since the last tick, which has to be a good one, with the mean power zd^T (J^T tau
   - d) of its ends: it is that of second order in dt and grows with every external force that the model does not know. A velocity
   that jumps from tick to tick, of an encoder, say, lets it jump by the energy of the jump over dt; limits->window = w makes it the
   running mean R += (r - R) / w, in which jumps count a w-th, and a force that stays counts after w ticks. work [ROLN_GUARD_WORK].
   */
#define ROLN_GUARD_MEM(X, S) X(decoded, 2 * S(N)) X(s, 2 * S(n))
#define ROLNI_BALANCE_WORK(S) (ROLN_LNN_TAPE(S, 1, 0, 1) + ROLN_MAX(ROLNI_EVAL_WORK(S, 1, 0, ROLNI_MASS, 1), 2 * S(n)))
#define ROLN_GUARD_WORK(S) \
    (0 ROLN_GUARD_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLN_AE_DECODE_TAPE(S, 2, 1), ROLN_MAX(ROLNI_BALANCE_WORK(S), ROLNI_TAU(S, 1))))
ROLN_INLINE uint32_t roln_guard_tick(const roln_trained *m, const roln_limits *limits, const roln_measured *x, const roln_real *z,
                                     const roln_real *zd, const roln_real *want, const roln_held *held, roln_real *work)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int N = m->model->ae.size[0], n = lnn->n;
    ROLN_GUARD_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_balance b = {0, 0};
    rolni_seen seen = {x->q, x->qd, z, zd, decoded, NULL};
    if (z && rolni_limits_decode(limits)) (void)rolni_decode(m, z, zd, decoded, work, s);
    if (z && want && limits->power > 0) {
        roln_real *w = work + roln_lnn_tape(lnn, 1, 0, 1);
        const rolni_tape t = rolni_tape_of(lnn, 1, 0, 1, work);
        rolni_state(m, z, zd, s);
        if (rolni_eval(lnn, 0, 1, rolni_net(m), s, NULL, ROLNI_MASS, work, w) == ROLN_OK) {
            b = rolni_balance_of(m, &t, zd, w);
            seen.balance = &b;
        }
    }
    return rolni_guard(m, limits, &seen, want, held, work);
}

/* A whole control tick, roln_encode, roln_control, roln_lift and roln_guard_tick: the same bits, but the state is decoded once
   and the networks are evaluated once. With limits->motors, and for a model with inputs, roln_allocate in place of roln_lift; what
   the motors cannot make of tau_z is in held->guard->missed. The energy residual counts on ref->load, of which roln_guard_tick by
   itself does not know. x measured, reference and gains in; z, zd [n] out, untouched if the
   encoder fails; held->tau: the one for the motors. Returns the faults of this tick. work [ROLN_TICK_WORK]. */
#define ROLN_TICK_MEM(X, S) X(decoded, 2 * S(N)) X(tau, S(N)) X(tau_z, S(n)) X(tape, ROLN_AE_DECODE_TAPE(S, 2, 1))
#define ROLNI_ALLOCATED_WORK(S) /* from tape on, which is not needed then */ \
    ROLN_MAX(0, ROLN_ALLOCATE_WORK(S) - (ROLN_AE_DECODE_TAPE(S, 2, 1)))
#define ROLN_TICK_WORK(S) \
    ROLN_MAX(ROLN_ENCODE_WORK(S, 2), \
             0 ROLN_TICK_MEM(ROLNI_SIZE, S) + \
                 ROLN_MAX(ROLN_MAX(S(control_work), ROLNI_ALLOCATED_WORK(S)), \
                          S(inputs) > 0 ? ROLNI_TAU(S, 1) : ROLN_AE_LIFT_WORK(S, 1)))
ROLN_INLINE uint32_t roln_tick(const roln_trained *m, const roln_limits *limits, const roln_measured *x, const roln_target *ref,
                               roln_real *z, roln_real *zd, const roln_held *held, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n, ae_sum = roln_ae_sum(ae), curves = ae->curves;
    roln_status st = roln_encode(m, x->q, x->qd, NULL, z, zd, NULL, work); /* done before anything else lies in work */
    ROLN_TICK_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_balance b = {0, 0};
    rolni_seen seen = {x->q, x->qd, NULL, NULL, decoded, NULL};
    if (st == ROLN_OK) {
        seen.z = z, seen.zd = zd;
        st = rolni_decode(m, z, zd, decoded, tape, work);
    }
    if (st == ROLN_OK && !rolni_motors_valid(m->model, limits->motors)) st = ROLN_E_SHAPE;
    if (st == ROLN_OK) st = rolni_control(m, z, zd, ref, tau_z, &b, work);
    if (st == ROLN_OK) seen.balance = &b;
    if (st == ROLN_OK && !limits->motors && m->model->inputs == 0) st = rolni_lift(m, 2, tape, tau_z, tau, work);
    else if (st == ROLN_OK) st = roln_allocate(m, z, limits->motors, tau_z, tau, &held->guard->missed, tape); /* not needed now */
    return rolni_guard(m, limits, &seen, st == ROLN_OK ? tau : NULL, held, work);
}

/* ---- 3 prediction and mechanics --------------------------------------------------------------- */

/* A held force in [nb][roln_force_size] (scaled) as the integrators ask for it (roln_force): on z it acts as J(z)^T tau, tau = in
   or B in. */
typedef struct {
    const roln_trained *m;
    const roln_real *in;
    roln_real *gae, *gB; /* gradients: of the autoencoder, of B [N][inputs]; NULL: not wanted */
    roln_real *work;     /* [ROLNI_FORCE_WORK] */
} rolni_torque;

/* tau_z = J(z)^T tau. */
#define ROLNI_TORQUE_MEM(X, S, nb) X(tape, ROLN_AE_DECODE_TAPE(S, 1, nb)) X(tau, ROLNI_TAU(S, nb))
#define ROLNI_TORQUE_WORK(S, nb) (0 ROLNI_TORQUE_MEM(ROLNI_SIZE, S, nb) + ROLN_AE_REDUCE_WORK(S, nb))
ROLN_FN void rolni_torque_eval(void *ctx, int nb, const roln_real *z, roln_real *tau_z)
{
    const rolni_torque *f = ROLNI_AS(const rolni_torque *, ctx);
    const roln_ae *ae = &f->m->model->ae;
    const int N = ae->size[0], ae_sum = roln_ae_sum(ae), curves = ae->curves, inputs = f->m->model->inputs;
    roln_real *work = f->work;
    ROLNI_TORQUE_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    roln_ae_decode(ae, 1, nb, f->m->theta, z, NULL, tape);
    roln_ae_reduce(ae, nb, f->m->theta, tape, rolni_tau(f->m, nb, f->in, tau), tau_z, work);
}

/* Its backward for the cotangent y [nb][n] of tau_z: adds to gz [nb][n] and, if params, to gae and gB. */
#define ROLNI_TORQUE_BWD_MEM(X, S, nb) X(tau, ROLNI_TAU(S, nb)) X(g, (S(inputs) > 0) * (nb) * S(N))
#define ROLNI_TORQUE_BWD_WORK(S, nb) (0 ROLNI_TORQUE_BWD_MEM(ROLNI_SIZE, S, nb) + ROLN_AE_REDUCE_BWD_WORK(S, nb))
ROLN_FN void rolni_torque_bwd(void *ctx, int nb, const roln_real *z, const roln_real *y, int params, roln_real *gz)
{
    const rolni_torque *f = ROLNI_AS(const rolni_torque *, ctx);
    const roln_model *md = f->m->model;
    const int N = md->ae.size[0], inputs = md->inputs;
    roln_real *work = f->work;
    ROLNI_TORQUE_BWD_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    if (inputs > 0) rolni_zero(nb * N, g);
    roln_ae_reduce_bwd(&md->ae, nb, f->m->theta, z, rolni_tau(f->m, nb, f->in, tau), y, gz, inputs > 0 ? g : NULL,
                       params ? f->gae : NULL, work);
    if (inputs > 0 && params && f->gB) roln_mm_at(N, nb, inputs, g, f->in, f->gB); /* unreached: gradients are of all parameters */
}

/* Its derivatives at one z: H [n][n] and, unless it is NULL, G [roln_force_size][n], which is J or, with inputs, B^T J. */
#define ROLNI_TORQUE_JAC_MEM(X, S) X(tau, ROLNI_TAU(S, 1)) X(T, S(n) * S(N)) X(u, S(n) * S(inputs))
#define ROLNI_TORQUE_JAC_WORK(S) (0 ROLNI_TORQUE_JAC_MEM(ROLNI_SIZE, S) + ROLN_AE_REDUCE_JAC_WORK(S))
ROLN_FN void rolni_torque_jac(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
{
    const rolni_torque *f = ROLNI_AS(const rolni_torque *, ctx);
    const roln_model *md = f->m->model;
    const int N = md->ae.size[0], n = md->lnn.n, inputs = md->inputs, size = roln_force_size(md);
    roln_real *work = f->work;
    int i, j;
    ROLNI_TORQUE_JAC_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_ae_reduce_jac(&md->ae, f->m->theta, z, rolni_tau(f->m, 1, f->in, tau), T, H, work);
    if (G && inputs > 0) roln_mm(n, N, inputs, T, f->m->theta + roln_params(md) - N * inputs, u);
    for (i = 0; G && i < size; i++)
        for (j = 0; j < n; j++)
            G[i * n + j] = (inputs > 0 ? u : T)[j * size + i];
}

/* Numbers of work of a force, at run time; what: 0 alone, 1 with a backward, 2 with derivatives. */
ROLN_FN int rolni_torque_work(const roln_model *md, int nb, int what)
{
    const roln_ae *ae = &md->ae;
    const int N = ae->size[0], N1 = roln_ae_size(ae, 1), N2 = roln_ae_size(ae, 2), inputs = md->inputs, n = md->lnn.n;
    const int ae_sum = roln_ae_sum(ae), curves = ae->curves, bent = roln_ae_bent(ae);
    const int eval = ROLNI_TORQUE_WORK(ROLNI_LOCAL, nb), back = ROLNI_TORQUE_BWD_WORK(ROLNI_LOCAL, nb);
    const int more = what == 0 ? 0 : what == 1 ? back : ROLNI_TORQUE_JAC_WORK(ROLNI_LOCAL);
    return more > eval ? more : eval;
}
#define ROLNI_FORCE_WORK(S, nb, what) /* the same at compile time */ \
    ROLN_MAX(ROLNI_TORQUE_WORK(S, nb), (what) > 1 ? ROLNI_TORQUE_JAC_WORK(S) : (what) > 0 ? ROLNI_TORQUE_BWD_WORK(S, nb) : 0)

/* The network with a held force on it, and all that hangs on it. */
typedef struct {
    roln_system sys; /* for the integrators; sys.force NULL: no force */
    roln_force force;
    rolni_torque torque;
} rolni_driven;

/* in [nb][roln_force_size], NULL: no force; work [ROLNI_FORCE_WORK]. d must stay where it is. Gradients need force.bwd, and set
   torque.gae and gB (rolni_drive_to), derivatives force.jac: what is not named here is not in programs without them. */
ROLN_INLINE void rolni_drive(const roln_trained *m, const roln_real *in, rolni_driven *d, roln_real *work)
{
    d->torque.m = m, d->torque.in = in, d->torque.work = work, d->torque.gae = d->torque.gB = NULL;
    d->force.eval = rolni_torque_eval, d->force.bwd = NULL, d->force.jac = NULL, d->force.ctx = &d->torque;
    d->sys.theta = rolni_net(m), d->sys.force = in ? &d->force : NULL;
}

/* tau_z = J(z)^T tau [n] of a force [N], or of inputs u through B, at z. ROLN_E_NOT_FINITE leaves tau_z untouched.
   work [ROLN_REDUCE_WORK]. */
#define ROLN_REDUCE_MEM(X, S) X(out, S(n)) X(own_tau, S(own) * S(force_size))
#define ROLN_REDUCE_WORK(S) (0 ROLN_REDUCE_MEM(ROLNI_SIZE, S) + ROLNI_TORQUE_WORK(S, 1))
ROLN_INLINE roln_status roln_reduce(const roln_trained *m, const roln_real *z, const roln_real *tau, roln_real *tau_z,
                                    roln_real *work)
{
    const int n = m->model->lnn.n, own = m->model->own, force_size = roln_force_size(m->model);
    const roln_real *each = rolni_each_force(m->model, m);
    ROLN_REDUCE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_driven d;
    int i;
    if (own) rolni_copy(force_size, tau, own_tau), rolni_multiply_each(1, force_size, each, own_tau);
    rolni_drive(m, own ? own_tau : tau, &d, work);
    rolni_torque_eval(&d.torque, 1, z, out);
    for (i = 0; i < n; i++)
        out[i] *= m->scale->q;
    /* unreached: a tau that is not finite leaves no finite out */
    if (!roln_all_finite(n, out) || !roln_all_finite(force_size, tau) || !roln_all_finite(n, z)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, out, tau_z);
    return ROLN_OK;
}

/* What acts over a step: tau [roln_force_size], NULL: none, and beside it load [n], a constant force on z itself, NULL: none. */
typedef struct {
    const roln_real *tau, *load;
} rolni_push;

/* Both as the integrators ask for them, of one state: J(z)^T tau + unit load. by_load: G is of the load, I, else of the torque. */
typedef struct {
    rolni_torque *torque;
    const roln_real *load;
    roln_real unit;
    int by_load;
} rolni_loaded;

ROLN_FN void rolni_loaded_eval(void *ctx, int nb, const roln_real *z, roln_real *tau_z)
{
    const rolni_loaded *f = ROLNI_AS(const rolni_loaded *, ctx);
    const int n = f->torque->m->model->lnn.n;
    int i;
    rolni_torque_eval(f->torque, nb, z, tau_z);
    for (i = 0; i < n; i++)
        tau_z[i] += f->unit * f->load[i];
}

ROLN_FN void rolni_loaded_jac(void *ctx, const roln_real *z, roln_real *H, roln_real *G)
{
    const rolni_loaded *f = ROLNI_AS(const rolni_loaded *, ctx);
    const int n = f->torque->m->model->lnn.n;
    int i;
    rolni_torque_jac(f->torque, z, H, f->by_load ? NULL : G);
    for (i = 0; i < n * n && G && f->by_load; i++)
        G[i] = i % (n + 1) == 0;
}

/* The load of a push joins the force of d; both stay where they are. Without one nothing is done. */
ROLN_INLINE void rolni_drive_load(const roln_trained *m, const roln_real *load, int by_load, rolni_driven *d, rolni_loaded *f)
{
    if (!load) return;
    f->torque = &d->torque, f->load = load, f->unit = m->scale->t * m->scale->t / m->scale->m, f->by_load = by_load;
    d->force.eval = rolni_loaded_eval, d->force.ctx = f;
}

/* roln_step under a push; angles stay on their turns, however far out, for what takes differences of states. work
   [ROLN_STEP_WORK without turned]. */
#define ROLN_STEP_MEM(X, S, force_size, force_work, tape_size) \
    X(s, 2 * S(n)) X(held, force_size) X(force, force_work) X(tape, tape_size)
#define ROLNI_TURNED_MEM(X, S) X(turned, (S(cossin) > 0) * S(n)) /* z of a model with angles, turned back */
#define ROLN_STEP_WORK(S) \
    (0 ROLNI_TURNED_MEM(ROLNI_SIZE, S) \
         ROLN_STEP_MEM(ROLNI_SIZE, S, S(force_size), ROLNI_FORCE_WORK(S, 1, 0), ROLN_LNN_TAPE(S, 1, 0, 1)) + \
     ROLN_LNN_STEP_WORK(S, (S(scheme) + 0), 0, 1))
ROLN_INLINE roln_status rolni_step(const roln_trained *m, roln_real *z, roln_real *zd, const rolni_push *by, roln_real dt,
                                   roln_real *work)
{
    const roln_model *md = m->model;
    const int n = md->lnn.n, size = roln_force_size(md);
    const roln_real t = m->scale->t, unit = rolni_force_unit(m->scale), *const each = rolni_each_force(md, m);
    ROLN_STEP_MEM(ROLNI_CARVE, ROLNI_LOCAL, size, rolni_torque_work(md, 1, 0), roln_lnn_tape(&md->lnn, 1, 0, 1))
    rolni_driven d;
    rolni_loaded loaded;
    roln_status st;
    int i;
    rolni_drive(m, by->tau || by->load ? held : NULL, &d, force);
    rolni_drive_load(m, by->load, 0, &d, &loaded);
    for (i = 0; i < size && (by->tau || by->load); i++)
        held[i] = by->tau ? by->tau[i] * unit : 0;
    if (by->tau) rolni_multiply_each(1, size, each, held);
    rolni_state(m, z, zd, s);
    st = roln_lnn_step(&md->lnn, &d.sys, md->scheme, 0, 1, dt / t, s, s, tape, work);
    if (st != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        s[n + i] /= t;
    if (!roln_all_finite(n, s + n)) return ROLN_E_NOT_FINITE;
    rolni_copy(n, s, z);
    rolni_copy(n, s + n, zd);
    return ROLN_OK;
}

/* Advance z, zd [n] by dt seconds under the force tau [N] on q (inputs u where the model has them), held over the step (NULL:
   none). One step of the model's integrator. Status of roln_lnn_step, ROLN_E_NOT_FINITE.
   An angle that is more than two turns, 4 pi, from 0 is brought within (-pi, pi] first, so that motion is the same on every turn
   (held by test_sums.c: test_turns). z, zd stay as they were unless ROLN_OK. work [ROLN_STEP_WORK]. */
ROLN_INLINE roln_status roln_step(const roln_trained *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt,
                                  roln_real *work)
{
    const rolni_push by = {tau, NULL};
    const int n = m->model->lnn.n, cossin = rolni_cossin(&m->model->lnn);
    roln_status st;
    ROLNI_TURNED_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (cossin == 0) return rolni_step(m, z, zd, &by, dt, work);
    rolni_copy(n, z, turned);
    rolni_turn_back(&m->model->lnn, 1, turned);
    if ((st = rolni_step(m, turned, zd, &by, dt, work)) == ROLN_OK) rolni_copy(n, turned, z);
    return st;
}

/* Derivatives of a step by its state, A [2n][2n], and by its torque, B [2n][roln_force_size], or by its load, L [2n][n]; B, L NULL:
   not wanted. */
typedef struct {
    roln_real *A, *B, *L;
} rolni_slopes;

/* roln_linear under a push, as rolni_step. work [ROLNI_LINEAR_WORK], wanted: columns of B or L. */
#define ROLN_LINEAR_MEM(X, S, size, wanted, force_work, tape_size) \
    X(s, 2 * S(n)) X(J, (2 * S(n) + (wanted)) * 2 * S(n)) X(held, size) X(force, force_work) X(tape, tape_size)
#define ROLN_LINEAR_WORK(S, wanted) (0 ROLNI_TURNED_MEM(ROLNI_SIZE, S) + ROLNI_LINEAR_WORK(S, wanted))
#define ROLNI_LINEAR_WORK(S, wanted) \
    (0 ROLN_LINEAR_MEM(ROLNI_SIZE, S, S(force_size), wanted, ROLNI_FORCE_WORK(S, 1, 2), \
                       ROLN_JAC_TAPES((S(scheme) + 0)) * ROLN_LNN_TAPE(S, 1, 1, 1)) + \
     ROLN_LNN_STEP_JAC_WORK(S, (S(scheme) + 0), wanted))
ROLN_INLINE roln_status rolni_linear(const roln_trained *m, roln_real *z, roln_real *zd, const rolni_push *by, roln_real dt,
                                     const rolni_slopes *to, roln_real *work)
{
    const roln_model *md = m->model;
    const int n = md->lnn.n, n2 = 2 * n, size = roln_force_size(md), wanted = to->L ? n : to->B ? size : 0, rows = n2 + wanted;
    const roln_real t = m->scale->t, unit = rolni_force_unit(m->scale), *const each = rolni_each_force(md, m);
    ROLN_LINEAR_MEM(ROLNI_CARVE, ROLNI_LOCAL, size, wanted, rolni_torque_work(md, 1, 2),
                    ROLN_JAC_TAPES(md->scheme) * roln_lnn_tape(&md->lnn, 1, 1, 1))
    rolni_driven d;
    rolni_loaded loaded;
    roln_status st;
    int i, j;
    rolni_drive(m, by->tau || by->load || to->B ? held : NULL, &d, force);
    d.force.jac = by->load ? rolni_loaded_jac : rolni_torque_jac;
    rolni_drive_load(m, by->load, to->L != NULL, &d, &loaded);
    for (i = 0; i < size; i++)
        held[i] = by->tau ? by->tau[i] * unit : 0;
    rolni_multiply_each(1, size, each, held);
    rolni_state(m, z, zd, s);
    if ((st = roln_lnn_step_jac(&md->lnn, &d.sys, md->scheme, wanted, dt / t, s, s, J, tape, work)) != ROLN_OK) return st;
    for (j = 0; j < rows; j++) { /* of z, zd t by z, zd t, and by tau unit, or by load t^2 / m */
        const roln_real tj = j < n ? 1 : j < n2 ? t : to->L ? loaded.unit : unit;
        for (i = 0; i < n2; i++) {
            roln_real *x = J + j * n2 + i;
            *x *= (i < n ? 1 : 1 / t) * tj;
            if (j >= n2 && each && !to->L) *x *= each[j - n2];
        }
    }
    for (i = 0; i < n; i++)
        s[n + i] /= t;
    /* unreached: where s overflows, J does */
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

/* Linearisation of roln_step: A = d(z,zd)+ / d(z,zd) [2n][2n] and B = d(z,zd)+ / d tau [2n][roln_force_size], for LQR, EKF and
   MPC. Also advances z, zd. tau NULL: no force; B NULL: not wanted. Status of roln_step; ROLN_E_NOT_FINITE also if A or B is not,
   ROLN_E_ILL_CONDITIONED of roln_lnn_step_jac; nothing is written unless ROLN_OK. All derivatives of a stage at once: about two
   steps with n = 2, three with n = 4, four with n = 6. work [ROLN_LINEAR_WORK], wanted: roln_force_size, without B 0. */
ROLN_INLINE roln_status roln_linear(const roln_trained *m, roln_real *z, roln_real *zd, const roln_real *tau, roln_real dt,
                                    roln_real *A, roln_real *B, roln_real *work)
{
    const rolni_push by = {tau, NULL};
    const rolni_slopes to = {A, B, NULL};
    const int n = m->model->lnn.n, cossin = rolni_cossin(&m->model->lnn);
    roln_status st;
    ROLNI_TURNED_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (cossin == 0) return rolni_linear(m, z, zd, &by, dt, &to, work);
    rolni_copy(n, z, turned);
    rolni_turn_back(&m->model->lnn, 1, turned);
    if ((st = rolni_linear(m, turned, zd, &by, dt, &to, work)) == ROLN_OK) rolni_copy(n, turned, z);
    return st;
}

/* The terms of M zdd + c + g + d = tau_z at (z, zd): M [n][n], c = C zd, g, d = R zd [n], kinetic and potential energy T, V;
   each pointer of out may be NULL. With E = T + V the power balance is dE/dt = zd^T (tau_z - d). Status of roln_lnn_terms,
   ROLN_E_NOT_FINITE also if a term is not in these units; outputs are written only on ROLN_OK. work [ROLN_TERMS_WORK]. */
#define ROLN_TERMS_MEM(X, S, tape_size) \
    X(s, 2 * S(n)) X(M, S(n) * S(n)) X(c, S(n)) X(g, S(n)) X(d, S(n)) X(T, 1) X(V, 1) X(tape, tape_size)
#define ROLN_TERMS_WORK(S) (0 ROLN_TERMS_MEM(ROLNI_SIZE, S, ROLN_LNN_TAPE(S, 1, 0, 1)) + ROLN_LNN_TERMS_WORK(S))
ROLN_INLINE roln_status roln_terms(const roln_trained *m, const roln_real *z, const roln_real *zd, const roln_terms_out *out,
                                   roln_real *work)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int n = lnn->n;
    const roln_real unit = m->scale->m, f = unit / (m->scale->t * m->scale->t);
    ROLN_TERMS_MEM(ROLNI_CARVE, ROLNI_LOCAL, roln_lnn_tape(lnn, 1, 0, 1))
    const roln_terms_out mine = {out->M ? M : NULL, out->c ? c : NULL, out->g ? g : NULL, d, T, V};
    roln_status st;
    int i;
    rolni_state(m, z, zd, s);
    rolni_zero(2 * n, c); /* c, g: not asked for */
    if ((st = roln_lnn_terms(lnn, rolni_net(m), s, &mine, tape, work)) != ROLN_OK) return st;
    for (i = 0; i < 3 * n + 2; i++) /* c, g, d, T, V follow each other */
        c[i] *= f;
    for (i = 0; i < n * n && out->M; i++)
        M[i] *= unit;
    /* unreached: M that overflows does so in T as well */
    if (!roln_all_finite(3 * n + 2, c) || (out->M && !roln_all_finite(n * n, M))) return ROLN_E_NOT_FINITE;
    if (out->M) rolni_copy(n * n, M, out->M);
    if (out->c) rolni_copy(n, c, out->c);
    if (out->g) rolni_copy(n, g, out->g);
    if (out->d) rolni_copy(n, d, out->d);
    if (out->T) *out->T = *T;
    if (out->V) *out->V = *V;
    return ROLN_OK;
}

/* Levels c [n] and velocities v [n] of the dry friction c_j tanh(zd_j / v_j). */
ROLN_INLINE void roln_friction(const roln_trained *m, roln_real *c, roln_real *v)
{
    const roln_lnn *lnn = &m->model->lnn;
    const roln_real *logs = rolni_net(m) + rolni_friction_at(lnn), t = m->scale->t;
    int i;
    for (i = 0; i < lnn->n; i++)
        c[i] = roln_exp(logs[i]) / (t * t) * m->scale->m, v[i] = roln_exp(logs[lnn->n + i]) / t;
}

/* Apparent inertia in the full space as an operator, y = D^T M D v with D = D(phi(z)): symmetric, positive semi-definite of
   rank n, and 1/2 qd^T y(qd) = T on the manifold. v [N] in, y [N] out (may be v). Status of roln_lnn_terms, ROLN_E_NOT_FINITE;
   y is untouched unless ROLN_OK. work [ROLN_INERTIA_WORK]. */
#define ROLN_INERTIA_MEM(X, S, lnn_tape_size) \
    X(s, 2 * S(n)) X(p, S(n)) X(lnn_tape, lnn_tape_size) X(tape, ROLN_AE_ENCODE_REST(S, 2, 1)) X(jet, 2 * S(N))
#define ROLN_INERTIA_WORK(S) \
    (0 ROLN_INERTIA_MEM(ROLNI_SIZE, S, ROLN_LNN_TAPE(S, 1, 0, 1)) + \
     ROLN_MAX(ROLNI_EVAL_WORK(S, 1, 0, ROLNI_MASS, 1), \
              ROLN_MAX(ROLN_AE_DECODE_TAPE(S, 1, 1), ROLN_MAX(S(n), ROLN_AE_LIFT_WORK(S, 1)))))
ROLN_INLINE roln_status roln_inertia(const roln_trained *m, const roln_real *z, const roln_real *v, roln_real *y, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const roln_lnn *lnn = &m->model->lnn;
    const int N = ae->size[0], n = lnn->n, N1 = roln_ae_size(ae, 1), ae_sum = roln_ae_sum(ae);
    ROLN_INERTIA_MEM(ROLNI_CARVE, ROLNI_LOCAL, roln_lnn_tape(lnn, 1, 0, 1))
    const rolni_tape t = rolni_tape_of(lnn, 1, 0, 1, lnn_tape);
    roln_status st;
    int i;
    rolni_copy(n, z, s);
    rolni_zero(n, s + n);
    if ((st = rolni_eval(lnn, 0, 1, rolni_net(m), s, NULL, ROLNI_MASS, lnn_tape, work)) != ROLN_OK) return st;
    roln_ae_decode(ae, 1, 1, m->theta, z, jet, work);
    for (i = 0; i < N; i++)
        jet[N + i] = v[i] / m->scale->q;
    rolni_divide_each(1, N, rolni_each(m->model, m), jet + N);
    roln_ae_encode(ae, 2, 1, m->theta, jet, s, tape); /* jet is the end of tape */
    rolni_mul(lnn, &t, 0, s + n, p, work);
    roln_ae_lift_tape(ae, 2, 1, tape, tape);
    roln_ae_lift(ae, 1, m->theta, tape, p, jet, work);
    for (i = 0; i < N; i++)
        jet[i] = jet[i] / m->scale->q * m->scale->m;
    rolni_divide_each(1, N, rolni_each(m->model, m), jet);
    if (!roln_all_finite(N, jet)) return ROLN_E_NOT_FINITE;
    rolni_copy(N, jet, y);
    return ROLN_OK;
}

/* ---- 4 Riccati equations ---------------------------------------------------------------------- */

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
#define ROLN_RICCATI_WORK(n, m) (0 ROLN_RICCATI_MEM(ROLNI_SIZE, n, m) + ROLN_TRIANGLE_WORK((m) + 2 * (n), (m) + (n)))
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

/* S [2n][n] becomes the triangle of [X Y^T; I], X, Y [n][n]. work [ROLN_TRIANGLE_WORK(2n, n)]. */
ROLN_FN void rolni_border(int n, const roln_real *X, const roln_real *Y, roln_real *S, roln_real *work)
{
    int i;
    roln_mm_bt(n, n, n, X, Y, S);
    rolni_zero(n * n, S + n * n);
    for (i = 0; i < n; i++)
        S[(n + i) * n + i] = 1;
    roln_triangle(2 * n, n, S, work);
}

/* A step of the equation X = A^T X (I + G X)^-1 A + H, G = L^T L, H = D^T D, with X = H: what is left, X - H, solves the same
   equation with
       A' = (I + G H)^-1 A     G' = (I + G H)^-1 G     H' = A^T H (I + G H)^-1 A
   A' is the loop that is closed by a feedback that knows H. With F = D L^T and the triangles R1 of [F; I], R2 of [F^T; I]
       L' = R1^-T L     D' = R2^-T D A     A' = A - L'^T (R1^-T F^T) D A
   A, L, D [n][n] in and out. work [ROLNI_SHIFT_WORK]. */
#define ROLNI_SHIFT_MEM(X, n) X(E, (n) * (n)) X(V, 2 * (n) * (n)) X(W, (n) * (n)) X(S, 2 * (n) * (n))
#define ROLNI_SHIFT_WORK(n) (0 ROLNI_SHIFT_MEM(ROLNI_SIZE, n) + ROLN_TRIANGLE_WORK(2 * (n), n))
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

/* X [n][n] becomes the triangle of [X; Y]. S [2n][n]. work [ROLN_TRIANGLE_WORK(2n, n)]. */
ROLN_FN void rolni_stack(int n, const roln_real *Y, roln_real *X, roln_real *S, roln_real *work)
{
    rolni_copy(n * n, X, S);
    rolni_copy(n * n, Y, S + n * n);
    roln_triangle(2 * n, n, S, work);
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
    (0 ROLNI_DOUBLE_MEM(ROLNI_SIZE, n, m) + ROLN_MAX(ROLNI_SHIFT_WORK(n), ROLN_TRIANGLE_WORK(m, n)))
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
    if (m > n) roln_triangle(m, n, S, work);
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
    (0 ROLNI_POLICY_MEM(ROLNI_SIZE, n, m) + ROLN_TRIANGLE_WORK((n) + ROLN_MAX(n, m), n))
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
    roln_triangle(n + m, n, S, work);
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

/* ---- 5 optimal control ------------------------------------------------------------------------ */

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
            const roln_real fall = rolni_ocp_fall(o, i / m, j), step = fall - rolni_ocp_fall(o, i / m - 1, j);
            b->t[side * count + i] = side > 1 ? b->rate[j] + (away ? step : -step)
                                              : b->room[j] + (away ? fall : 2 * rolni_ocp_last(o, j) - fall);
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

/* Y [m][n] = -(L L^T)^-1 Y. */
ROLN_FN void rolni_ocp_solve(int m, int n, const roln_real *L, roln_real *Y)
{
    int i, j, k;
    for (i = 0; i < m; i++) {
        const roln_real by = 1 / L[i * m + i]; /* a division takes as long as many products */
        for (k = 0; k < i; k++)
            for (j = 0; j < n; j++)
                Y[i * n + j] -= L[i * m + k] * Y[k * n + j];
        for (j = 0; j < n; j++)
            Y[i * n + j] *= by;
    }
    for (i = m - 1; i >= 0; i--) {
        const roln_real by = -1 / L[i * m + i];
        for (k = i + 1; k < m; k++)
            for (j = 0; j < n; j++)
                Y[i * n + j] += L[k * m + i] * Y[k * n + j];
        for (j = 0; j < n; j++)
            Y[i * n + j] *= by;
    }
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
    int j;
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
    return ROLN_OK;
}

/* u within its limits in spite of rounding errors. */
ROLN_FN void rolni_ocp_clip(const roln_ocp *p, roln_real *u)
{
    int i;
    for (i = 0; i < p->steps * p->m; i++) {
        const roln_real last = !p->rate ? 0 : i < p->m ? p->last[i] : u[i - p->m], most = rolni_ocp_most(p, i % p->m);
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
   unless ROLN_OK. ROLN_E_LENGTH: a size, or iterations, below 1; ROLN_E_RANGE: most, rate or last; ROLN_E_NOT_SPD: r, or a Hessian
   by u_k, as an indefinite Q may make it, which is not checked itself, or where weights, or rates and limits, are too far apart for
   the digits (rates down to 1e-24 of a limit are not: test_at_limit); ROLN_E_NOT_FINITE: another input. Each step of each iteration
   costs about 3 n^3 + 5 n^2 m + 3 n m^2 multiply-adds.
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
    /* unreached: what overflows is no positive Hessian before */
    if (!roln_all_finite(count, u) || !roln_all_finite((steps + 1) * n, x) || !roln_all_finite(steps * m * n, K))
        return ROLN_E_NOT_FINITE; /* unreached: as above */
    return ROLN_OK;
}

/* ---- 6 feedback and estimates ----------------------------------------------------------------- */

/* What feedback shall cost, a step: sum q_i dq_i^2 + sum qd_i dqd_i^2 + sum u_j du_j^2, of deviations of joints dq = J dz,
   dqd = J dzd, and of motors du. Weights are of joints and motors, since z has no unit that means anything: 1 / d^2, where all
   these deviations d are equally bad. */
typedef struct {
    const roln_real *q, *qd;   /* [N] 1/rad^2, s^2/rad^2; 0 or more */
    const roln_real *u;        /* [count] 1/(Nm)^2, above 0 */
    roln_real dt;              /* a step, s: as long as u is held */
    const roln_motors *motors; /* NULL: one at each joint, or the learned inputs: count = roln_force_size; mu is not read */
} roln_cost;

/* q = phi(z) [N], and J [N][n], whose column j is qd of unit zd. work [ROLNI_POSE_WORK]. */
#define ROLNI_POSE_MEM(X, S) X(e, S(n)) X(x, 2 * S(N)) X(s2, 2 * S(n))
#define ROLNI_POSE_WORK(S) (0 ROLNI_POSE_MEM(ROLNI_SIZE, S) + ROLN_AE_DECODE_TAPE(S, 2, 1))
ROLN_INLINE roln_status rolni_pose(const roln_trained *m, const roln_real *z, roln_real *q, roln_real *J, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    ROLNI_POSE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    int i, j;
    for (j = 0; j < n; j++) {
        roln_status st;
        for (i = 0; i < n; i++)
            e[i] = i == j;
        if ((st = rolni_decode(m, z, e, x, work, s2)) != ROLN_OK) return st;
        rolni_copy(N, x, q);
        for (i = 0; i < N; i++)
            J[i * n + j] = x[N + i];
    }
    return ROLN_OK;
}

/* The force [roln_force_size] that motors make by u [count]: B u, in tau [N], or u itself where they are the force. */
ROLN_FN const roln_real *rolni_motors_tau(int N, const roln_motors *f, const roln_real *u, roln_real *tau)
{
    if (!f || !f->B || !u) return u;
    roln_mm_bt(1, f->count, N, u, f->B, tau);
    return tau;
}

/* Where motors act, NULL: at each joint, or the learned inputs; their u [count], NULL: none; a load [n] on z, NULL: none. */
typedef struct {
    const roln_motors *motors;
    const roln_real *u, *load;
} rolni_acting;

/* roln_linear under what acts; s [2n] in and out, A [2n][2n], B [2n][count] out. work [ROLNI_LINEAR_MOTORS_WORK]. */
#define ROLNI_LINEAR_MOTORS_MEM(X, S) X(tau, S(N)) X(F, 2 * S(n) * S(force_size))
#define ROLNI_LINEAR_MOTORS_WORK(S) (0 ROLNI_LINEAR_MOTORS_MEM(ROLNI_SIZE, S) + S(linear_work))
ROLN_INLINE roln_status rolni_linear_motors(const roln_trained *m, const rolni_acting *by, roln_real *s, roln_real dt, roln_real *A,
                                            roln_real *B, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, force_size = roln_force_size(m->model);
    const roln_motors *f = by->motors;
    ROLNI_LINEAR_MOTORS_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    const rolni_push push = {rolni_motors_tau(N, f, by->u, tau), by->load};
    const rolni_slopes to = {A, F, NULL};
    const roln_status st = rolni_linear(m, s, s + n, &push, dt, &to, work);
    if (st != ROLN_OK) return st;
    if (f && f->B) roln_mm(2 * n, N, f->count, F, f->B, B);
    else rolni_copy(2 * n * force_size, F, B);
    return ROLN_OK;
}

/* The step at s [2n] = [z; zd] under the motors' u [count], NULL: none, as A [2n][2n], B [2n][count], and D [2n][2n], in which
   |D (dz, dzd)|^2 is the cost of the joints. Dry friction has no slope but where tanh is steep, about rest, and there it would look
   like ever so much damping: A is that at velocities 4 v farther from 0. work [ROLNI_COST_WORK]. */
#define ROLNI_COST_MEM(X, S) X(at, 2 * S(n))
#define ROLNI_COST_JOINTS_MEM(X, S) X(q, S(N)) X(J, S(N) * S(n)) X(W, 2 * S(N) * S(n))
#define ROLNI_COST_WORK(S) \
    (0 ROLNI_COST_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(ROLNI_LINEAR_MOTORS_WORK(S), 0 ROLNI_COST_JOINTS_MEM(ROLNI_SIZE, S) + \
                                               ROLN_MAX(ROLNI_POSE_WORK(S), ROLN_TRIANGLE_WORK(S(N), S(n)))))
ROLN_INLINE roln_status rolni_cost_joints(const roln_trained *m, const roln_cost *cost, const roln_real *z, roln_real *D,
                                          roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    ROLNI_COST_JOINTS_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_status st;
    int i, k;
    for (i = 0; i < N; i++)
        if (cost->q[i] < 0 || cost->qd[i] < 0) return ROLN_E_NOT_SPD;
    if ((st = rolni_pose(m, z, q, J, work)) != ROLN_OK) return st;
    for (i = 0; i < N * n; i++) {
        W[i] = ROLN_SQRT(cost->q[i / n]) * J[i];
        W[N * n + i] = ROLN_SQRT(cost->qd[i / n]) * J[i];
    }
    rolni_zero(4 * n * n, D);
    for (k = 0; k < 2; k++) {
        roln_triangle(N, n, W + k * N * n, work);
        for (i = 0; i < n; i++)
            rolni_copy(n, W + (k * N + i) * n, D + (k * n + i) * 2 * n + k * n);
    }
    return roln_all_finite(4 * n * n, D) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

ROLN_INLINE roln_status rolni_cost_at(const roln_trained *m, const roln_cost *cost, const roln_real *s, const roln_real *u,
                                      roln_real *A, roln_real *B, roln_real *D, roln_real *work)
{
    const int n = m->model->lnn.n;
    const roln_trained driven = *m; /* a copy, whose address escapes: of m itself the compiler keeps what it knows */
    const roln_real *logs = rolni_net(m) + rolni_friction_at(&m->model->lnn) + n; /* log v */
    const rolni_acting by = {cost->motors, u, NULL};
    roln_status st;
    int i;
    ROLNI_COST_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (!rolni_motors_valid(m->model, cost->motors)) return ROLN_E_LENGTH;
    if (!(cost->dt > 0)) return ROLN_E_RANGE;
    rolni_copy(2 * n, s, at);
    for (i = 0; i < n && m->model->lnn.friction; i++)
        at[n + i] += (at[n + i] < 0 ? -4 : 4) * roln_exp(logs[i]) / m->scale->t;
    st = rolni_linear_motors(&driven, &by, at, cost->dt, A, B, work);
    return st == ROLN_OK ? rolni_cost_joints(m, cost, s, D, work) : st;
}

/* Feedback of least cost about a state that u keeps, for ever (linear-quadratic regulator):
       u_k = u - K (s_k - s),   K [count][2n],   and what then is left of the cost, ds^T P ds, P [2n][2n] (NULL: not wanted).
   s [2n] = [z; zd], a pose has zd = 0; u [count] the motors' torques there, held over a step, NULL: none. K, P are untouched unless
   ROLN_OK. ROLN_E_NO_CONVERGENCE: the motors cannot stabilise it, or no joint that weighs sees what has to be stabilised;
   ROLN_E_NOT_SPD: a weight of the motors is not above 0, or one of the joints is below; ROLN_E_LENGTH: motors;
   ROLN_E_RANGE: dt; ROLN_E_NOT_FINITE: P; status of roln_linear, roln_dare. Dry friction is left out, it is no damping. Cost
   roln_linear and roln_dare of 2n. work [ROLN_LQR_WORK]. */
#define ROLN_LQR_MEM(X, S) X(A, 4 * S(n) * S(n)) X(B, 2 * S(n) * S(force_size)) X(D, 4 * S(n) * S(n)) X(C, 4 * S(n) * S(n))
#define ROLN_LQR_WORK(S) \
    (0 ROLN_LQR_MEM(ROLNI_SIZE, S) + ROLN_MAX(S(cost_work), ROLN_DARE_WORK(2 * S(n), S(force_size))))
ROLN_INLINE roln_status roln_lqr(const roln_trained *m, const roln_cost *cost, const roln_real *s, const roln_real *u, roln_real *K,
                                 roln_real *P, roln_real *work)
{
    const int n2 = 2 * m->model->lnn.n, n = m->model->lnn.n, force_size = roln_force_size(m->model);
    const int motors = rolni_torques(m->model, cost->motors);
    ROLN_LQR_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_status st = rolni_cost_at(m, cost, s, u, A, B, D, work);
    if (st == ROLN_OK) st = roln_dare(n2, motors, A, B, D, cost->u, C, B, work);
    if (st != ROLN_OK) return st;
    if (P) {
        rolni_zero(n2 * n2, A);
        roln_mm_at(n2, n2, n2, C, C, A);
        if (!roln_all_finite(n2 * n2, A)) return ROLN_E_NOT_FINITE;
        rolni_copy(n2 * n2, A, P);
    }
    rolni_copy(motors * n2, B, K);
    return ROLN_OK;
}

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

/* The same along a reference s [count + 1][2n] that u [count][motors] (NULL: none) drives, step k from s_k to s_k+1, up to its end,
   where ds^T P ds remains to be paid: P [2n][2n], positive semi-definite, of roln_lqr there, say; NULL: the weights of the joints.
       u'_k = u_k - K_k (s'_k - s_k),   K [count][motors][2n]
   By steps of roln_riccati from the last to the first. ROLN_E_LENGTH: count below 1, motors; else as roln_lqr, ROLN_E_NOT_SPD
   also of P; then those K are written that were computed before it failed, the last ones. work [ROLN_LQR_ALONG_WORK]. */
#define ROLNI_LQR_END_MEM(X, S) X(l, 2 * S(n))
#define ROLN_LQR_ALONG_WORK(S) \
    (0 ROLN_LQR_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(S(cost_work), ROLN_MAX(ROLN_RICCATI_WORK(2 * S(n), S(force_size)), \
                                     0 ROLNI_LQR_END_MEM(ROLNI_SIZE, S) + ROLN_EIG_WORK(2 * S(n)))))

/* C of P = C^T C, P [2n][2n]: by eigenvalues of P with its diagonal scaled to 1, so that light states keep their digits beside
   heavy ones (test_control.c: test_light_states). */
ROLN_INLINE roln_status rolni_lqr_end(int n, const roln_real *P, roln_real *C, roln_real *work)
{
    const int n2 = 2 * n;
    ROLNI_LQR_END_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_status st = rolni_goal_weighs(n2, P, C);
    int i, j;
    if (st != ROLN_OK) return st;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++) {
            const roln_real most = ROLN_SQRT(P[i * (n2 + 1)]) * ROLN_SQRT(P[j * (n2 + 1)]);
            C[i * n2 + j] = most > 0 ? P[i * n2 + j] / most : 0;
        }
    /* unreached: numbers of at most 1 have eigenvalues */
    if ((st = roln_eig(n2, C, l, C, work)) != ROLN_OK) return st;
    for (i = 0; i < n2; i++)
        for (j = 0; j < n2; j++)
            C[i * n2 + j] *= l[i] > 0 ? ROLN_SQRT(l[i]) * ROLN_SQRT(P[j * (n2 + 1)]) : 0;
    return ROLN_OK;
}

ROLN_INLINE roln_status roln_lqr_along(const roln_trained *m, const roln_cost *cost, int count, const roln_real *s,
                                       const roln_real *u, const roln_real *P, roln_real *K, roln_real *work)
{
    const int n = m->model->lnn.n, n2 = 2 * n, force_size = roln_force_size(m->model);
    const int motors = rolni_torques(m->model, cost->motors);
    ROLN_LQR_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_status st;
    int k;
    if (count < 1 || !rolni_motors_valid(m->model, cost->motors)) return ROLN_E_LENGTH;
    st = P ? rolni_lqr_end(n, P, C, work) : rolni_cost_joints(m, cost, s + count * n2, C, work);
    for (k = count - 1; k >= 0 && st == ROLN_OK; k--) {
        st = rolni_cost_at(m, cost, s + k * n2, u ? u + k * motors : NULL, A, B, D, work);
        if (st == ROLN_OK) st = roln_riccati(n2, motors, A, B, D, cost->u, C, K + k * motors * n2, work);
    }
    return st;
}

/* What a filter is told of a machine and of its encoders. */
typedef struct {
    roln_real dt;   /* time from tick to tick, s */
    roln_real q;    /* deviation of a measured joint from phi(z), rad: the root of noise^2 (of an encoder: its step / sqrt(12))
                       plus the mean square of q - phi(rho(q)), what the chart leaves of the joint */
    roln_real tau;  /* deviation of a torque on each joint that nobody knows, held over a tick, in the model's unit: its error;
                       of joints with units of their own tau / each_j */
    roln_real gate; /* deviations from what is expected beyond which a measured joint is not used; 0: every one is */
    int lost;       /* ticks in a row of which most is beyond the gate that are bridged */
    /* what follows may be left out */
    const roln_real *q_each, *tau_each; /* [N] in place of q, of tau; NULL: these */
    roln_real load; /* deviation by which the torque of a load on each joint wanders in a second, as tau; 0: there is none */
} roln_noise;

/* What roln_filter_tick says, beside ROLN_FAULT_INPUT, ROLN_FAULT_STATUS and ROLN_FAULT_RANGE; no bit is one of a guard. */
#define ROLN_FILTER_MISSING 512u  /* A joint was not measured. */
#define ROLN_FILTER_OUTLIER 1024u /* A measured joint is beyond noise.gate and was not used. */
#define ROLN_FILTER_START 2048u   /* The filter started at the measured pose, at rest. */
#define ROLN_FILTER_NONE 4096u    /* There is no estimate. The filter waits for every joint or for valid settings. */

/* Returns the name of the lowest bit of a word of faults and one sentence about it. The word is that of NAME_tick,
   NAME_guard_tick or NAME_filter_tick. To print all bits: for (; faults; faults &= faults - 1) puts(roln_fault_text(faults));
   0 gives "no fault", a bit that has no name "unknown fault". The texts are linked only into programs that call this function
   (test_safety.c: test_texts). */
ROLN_FN const char *roln_fault_text(uint32_t faults)
{
    static const char *const text[] = {
        "ROLN_FAULT_INPUT: q, qd, dt, a limit or the motors are not usable numbers.",
        "ROLN_FAULT_STATUS: A function on the way returned a status other than ROLN_OK.",
        "ROLN_FAULT_OUTPUT: A torque is NaN or infinite.",
        "ROLN_FAULT_LIMIT: A torque is beyond a limit of torque or rate, and limits.strict is 1.",
        "ROLN_FAULT_RANGE: z or zd is outside the range of the training data, widened by limits.margin.",
        "ROLN_FAULT_ENERGY: |dE/dt - zd^T (J^T tau - d)| is beyond limits.power.",
        "ROLN_FAULT_EXPIRED: More than limits.hold ticks in a row were bad. Torques are safe until the guard is zeroed.",
        "ROLN_FAULT_MANIFOLD: q or qd is farther than limits.q_off or limits.qd_off from what the model can represent.",
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
    int known;                 /* 1: there is an estimate */
    int lost;                  /* lost ticks in a row */
    int used;                  /* joints that the last tick used */
    roln_real nis;             /* its normalised innovation squared: if all is well, chi-square of `used` degrees */
} roln_filter;

/* A filter and its estimate: z, zd [n] and F [2n][2n], F^T F the covariance of their error. With load [n], NULL: none, it estimates
   a constant force on z, too, J, that acts beside the known one: then F [3n][3n] is of z, zd, load. */
typedef struct {
    roln_filter *filter;
    roln_real *z, *zd, *F;
    roln_real *load;
} roln_estimate;

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

/* What a filter works on: state [side], side = 2n or, with a load, 3n, and factor, the pose q [N] that the state decodes to, J
   [N][n] there; room for products A [side][side] and for rows of triangles. load: 1 or 0. work [ROLN_FILTER_WORK without them]. */
#define ROLNI_FILTER_SIDE(S, load) ((2 + (load)) * S(n))
#define ROLNI_FILTER_ROWS(S, load) /* of a measurement, or, with a load, of two noises */ \
    ROLN_MAX((ROLNI_FILTER_SIDE(S, load) + S(N)) * (ROLNI_FILTER_SIDE(S, load) + 1), (load) * 15 * S(n) * S(n))
#define ROLN_FILTER_MEM(X, S, load) \
    X(s, ROLNI_FILTER_SIDE(S, load)) X(F, ROLNI_FILTER_SIDE(S, load) * ROLNI_FILTER_SIDE(S, load)) \
    X(A, ROLNI_FILTER_SIDE(S, load) * ROLNI_FILTER_SIDE(S, load)) X(q, S(N)) X(J, S(N) * S(n)) \
    X(rows, ROLNI_FILTER_ROWS(S, load))
typedef struct {
    ROLN_FILTER_MEM(ROLNI_FIELD, ROLNI_LOCAL, 0)
    int load, side;
    roln_real *work;
} rolni_filter;

ROLN_INLINE void rolni_filter_lay(int N, int n, int load, rolni_filter *b, roln_real *work)
{
    ROLN_FILTER_MEM(ROLNI_LAY, ROLNI_LOCAL, load)
    b->load = load, b->side = ROLNI_FILTER_SIDE(ROLNI_LOCAL, load), b->work = work;
}

/* A factor of what torques of deviation d do to z, T^T T = by^2 J^T diag(d^2) J, a triangle in T [N][n]: d is dev [N]; NULL: one,
   in units of the joints. Work: ROLN_TRIANGLE_WORK(N, n). */
ROLN_INLINE void rolni_filter_torques(const roln_trained *m, const rolni_filter *f, const roln_real *dev, roln_real one,
                                      roln_real by, roln_real *T, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    const roln_real *each = rolni_each(m->model, m);
    int i;
    for (i = 0; i < N * n; i++)
        T[i] = by * (dev ? dev[i / n] : each ? one / each[i / n] : one) * f->J[i];
    roln_triangle(N, n, T, work);
}

/* The last rows of a factor, W [n][3n]: what the load has wandered in some seconds, W^T W = seconds J^T diag(noise->load^2) J. */
#define ROLNI_WANDER_MEM(X, S) X(T, S(N) * S(n))
ROLN_INLINE void rolni_filter_wander(const roln_trained *m, const roln_noise *noise, roln_real seconds, const rolni_filter *f,
                                     roln_real *W)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    roln_real *work = f->work;
    ROLNI_WANDER_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    int i;
    rolni_filter_torques(m, f, NULL, noise->load, ROLN_SQRT(seconds), T, work);
    rolni_zero(n * f->side, W);
    for (i = 0; i < n; i++)
        rolni_copy(n, T + i * n, W + i * f->side + 2 * n);
}

/* Factor W [n][side] of what unknown torques do to the state in a tick, W^T W: with T^T T = J^T diag(tau^2) J, a triangle,
       W = [dt^2/2 G  dt G  0],   G = T M^-1
   Outside of the range seen in training the model guesses: ten times as much, a guess, too. */
#define ROLNI_UNKNOWN_MEM(X, S) X(M, S(n) * S(n)) X(T, S(N) * S(n))
#define ROLNI_UNKNOWN_WORK(S) (0 ROLNI_UNKNOWN_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLN_TERMS_WORK(S), ROLN_TRIANGLE_WORK(S(N), S(n))))
ROLN_INLINE roln_status rolni_filter_unknown(const roln_trained *m, const roln_noise *noise, const rolni_filter *f, roln_real *W)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    const roln_real by = roln_in_range(m, 0, f->s, f->s + n) ? noise->dt : 10 * noise->dt;
    roln_real *work = f->work;
    ROLNI_UNKNOWN_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    const roln_terms_out out = {M, NULL, NULL, NULL, NULL, NULL};
    roln_status st = roln_terms(m, f->s, f->s + n, &out, work);
    int i, j;
    if (st == ROLN_OK) st = roln_chol(n, M, M);
    if (st != ROLN_OK) return st;
    rolni_filter_torques(m, f, noise->tau_each, noise->tau, by, T, work);
    for (j = 0; j < n; j++) {
        roln_real *const w = W + j * f->side;
        if (f->load) rolni_zero(n, w + 2 * n);
        roln_solve_lower(n, M, T + j * n, w + n);
        roln_solve_lower_t(n, M, w + n, w + n);
        for (i = 0; i < n; i++)
            w[i] = noise->dt / 2 * w[n + i];
    }
    return ROLN_OK;
}

/* A tick on: the model's step under tau, NULL: none, and the load, and the triangle of [F A^T; W], with a load of [F [A L; 0 I]^T;
   W; what it wanders]. Then q, J there. */
ROLN_INLINE roln_status rolni_filter_predict(const roln_trained *m, const roln_noise *noise, const roln_real *tau,
                                             const rolni_filter *f)
{
    const int n = m->model->lnn.n, n2 = 2 * n, side = f->side;
    const rolni_push by = {tau, f->load ? f->s + n2 : NULL};
    const rolni_slopes to = {f->load ? f->rows : f->A, NULL, f->load ? f->rows + n2 * n2 : NULL};
    roln_status st = rolni_linear(m, f->s, f->s + n, &by, noise->dt, &to, f->work);
    int i, k;
    for (i = 0; i < n && st == ROLN_OK; i++)
        if (roln_lnn_angle(&m->model->lnn, i)) f->s[i] = roln_wrap(f->s[i]);
    for (i = 0; i < side && f->load && st == ROLN_OK; i++)
        for (k = 0; k < side; k++)
            f->A[i * side + k] = i >= n2 ? i == k : k < n2 ? to.A[i * n2 + k] : to.L[i * n + k - n2];
    if (st == ROLN_OK) st = rolni_pose(m, f->s, f->q, f->J, f->work);
    if (st == ROLN_OK) st = rolni_filter_unknown(m, noise, f, f->rows + side * side);
    if (st != ROLN_OK) return st;
    if (f->load) rolni_filter_wander(m, noise, noise->dt, f, f->rows + (side + n) * side);
    roln_mm_bt(side, side, side, f->F, f->A, f->rows);
    roln_triangle(f->load ? side + n2 : side + n, side, f->rows, f->work);
    rolni_copy(side * side, f->rows, f->F);
    /* unreached: what overflows here has overflowed in the pose */
    return roln_all_finite(side * side, f->F) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* What a measurement said. */
typedef struct {
    int measured, used; /* joints */
    roln_real nis;
} rolni_innovation;

/* Rows of the measured joints, each in its own deviation: [J_i F_z^T  e_i], F_z the columns of z, e_i = y_i - q_i; one beyond the
   gate, e_i^2 > gate^2 (|J_i F_z^T|^2 + 1), stays 0, and if there are more of them than others, all do. */
ROLN_INLINE rolni_innovation rolni_filter_rows(const roln_trained *m, const roln_noise *noise, roln_real gate, const roln_real *y,
                                               const rolni_filter *f)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, ns = f->side, side = ns + 1;
    roln_real *const rows = f->rows + ns * side;
    rolni_innovation in = {0, 0, 0};
    int i, k;
    rolni_zero((ns + N) * side, f->rows);
    for (i = 0; i < ns; i++)
        f->rows[i * side + i] = 1;
    for (i = 0; i < N; i++) {
        const roln_real r = noise->q_each ? noise->q_each[i] : noise->q;
        roln_real *const row = rows + i * side, e;
        if (!roln_finite(y[i])) continue;
        for (k = 0; k < ns; k++)
            row[k] = roln_dot(n, f->J + i * n, f->F + k * ns) / r;
        e = row[ns] = (y[i] - roln_lnn_near(&m->model->lnn, i, y[i], f->q[i])) / r;
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
   R^T R is I and more: nothing is subtracted, F^T F never loses its sign. R is left in f->A. */
ROLN_INLINE roln_status rolni_filter_correct(const roln_trained *m, const roln_noise *noise, roln_real gate, const roln_real *y,
                                             const rolni_filter *f, rolni_innovation *in)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, ns = f->side, side = ns + 1;
    roln_real *const w = f->work, *const d = w + ns, *const b = f->rows + ns;
    int i, k;
    *in = rolni_filter_rows(m, noise, gate, y, f);
    if (in->used == 0) return ROLN_OK;
    roln_triangle(ns + N, side, f->rows, f->work);
    for (i = 0; i < ns; i++)
        rolni_copy(ns, f->rows + i * side, f->A + i * ns);
    in->nis = f->rows[ns * side + ns] * f->rows[ns * side + ns];
    for (i = ns - 1; i >= 0; i--) {
        w[i] = b[i * side];
        for (k = i + 1; k < ns; k++)
            w[i] -= f->A[i * ns + k] * w[k];
        w[i] /= f->A[i * (ns + 1)];
    }
    roln_mm(1, ns, ns, w, f->F, d);
    for (i = 0; i < ns; i++)
        f->s[i] += d[i];
    for (i = 0; i < n; i++)
        if (roln_lnn_angle(&m->model->lnn, i)) f->s[i] = roln_wrap(f->s[i]);
    rolni_solve_upper_t(ns, ns, f->A, f->F);
    return roln_all_finite(ns, f->s) && roln_all_finite(ns * ns, f->F) && roln_finite(in->nis) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* At the pose y, at rest, in the middle of all velocities that training has seen, under no load but what it wanders in a second,
   which is more than a filter that has settled does not know of it, so that it settles no later than it follows; joints that were
   not measured as in z [n], NULL: none may be missing. ROLN_FILTER_START, or bits that say why not. */
ROLN_INLINE uint32_t rolni_filter_start(const roln_trained *m, const roln_noise *noise, const roln_real *y, const roln_real *z,
                                        const rolni_filter *f, rolni_innovation *in)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, side = f->side;
    int i;
    if (!z && !roln_all_finite(N, y)) return ROLN_FILTER_NONE;
    if (z && rolni_pose(m, z, f->q, f->J, f->work) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    for (i = 0; i < N; i++)
        f->q[i] = roln_finite(y[i]) ? y[i] : f->q[i];
    rolni_zero(N, f->J); /* qd */
    rolni_zero(side * side, f->F);
    for (i = 0; i < n; i++) {
        const roln_real wide = m->z_max[i] - m->z_min[i], fast = m->zd_max[i];
        if (!(wide > 0) || !(fast > 0)) return ROLN_FAULT_RANGE | ROLN_FILTER_NONE;
        f->F[i * (side + 1)] = wide;
        f->F[(n + i) * (side + 1)] = fast;
    }
    if (roln_encode(m, f->q, f->J, NULL, f->s, f->s + n, NULL, f->work) != ROLN_OK ||
        rolni_pose(m, f->s, f->q, f->J, f->work) != ROLN_OK)
        return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    if (f->load) rolni_zero(n, f->s + 2 * n), rolni_filter_wander(m, noise, 1, f, f->F + 2 * n * side);
    if (rolni_filter_correct(m, noise, 0, y, f, in) != ROLN_OK) return ROLN_FAULT_STATUS | ROLN_FILTER_NONE;
    return ROLN_FILTER_START;
}

/* A count that never ends: it stays at the largest number. */
ROLN_FN uint32_t rolni_counted(uint32_t count, int more)
{
    const uint32_t left = UINT32_MAX - count, add = ROLNI_AS(uint32_t, more);
    return count + ROLN_MIN(add, left);
}

/* One tick of a Kalman filter on the model, extended (linearised at the estimate) and in square roots: z, zd from positions alone.
       predict    the model's step under tau, roln_linear; covariance P = A P A^T + Q, Q that of unknown torques, noise->tau
       correct    by the joints that were measured, y = phi(z) + noise of deviation noise->q
   y [N] measured, NaN: that joint was not; NULL: none was. tau [roln_force_size] the force that was held since the last tick, NULL:
   none. e->z, zd, F out, and with e->load a load: the state is [z; zd; load], the load constant but for what it wanders,
   noise->load; it takes up what a model that is a little wrong leaves over, too; a start begins with none.
   A joint beyond noise->gate deviations of what is expected is not used, and counted; if more are than are not, none is used. A
   tick that leaves fewer than n joints because of that is lost; noise->lost of them in a row are bridged by the model, at the next
   one the filter starts again, ROLN_FILTER_START: at the pose that is measured, at rest, with zd as unknown as training has seen
   it, which a few ticks mend. It starts so with the first measurement of all joints.
   Angles of joints may be on any turn; z of an angle is within (-pi, pi].
   Returns bits, also added to e->filter->faults: ROLN_FILTER_..; ROLN_FAULT_RANGE: the estimate is outside of the range that
   training has seen, where unknown torques count ten times, or, with ROLN_FILTER_NONE, the model holds no range (NAME_fit_range);
   ROLN_FAULT_STATUS: a function on the way failed, or led further out than ten times the width of that range; the estimate is the
   last one, unless this measurement starts it again, or else the next;
   ROLN_FAULT_INPUT: settings that make no sense, then nothing is done, and ROLN_FILTER_NONE stands beside it, for the last estimate
   grows old; or tau is not finite, then it is left out. The estimate is always finite. Cost roln_linear, roln_terms, n roln_decode,
   8 n^2 (6 n + N) multiply-adds, with a load 18 n^2 (10 n + N).
   work [ROLN_FILTER_WORK], load: 1 with e->load, else 0. */
#define ROLN_FILTER_WORK(S, load) \
    (0 ROLN_FILTER_MEM(ROLNI_SIZE, S, load) + \
     ROLN_MAX(ROLNI_UNKNOWN_WORK(S), \
              ROLN_MAX(ROLN_MAX((load) > 0 ? S(load_work) : S(state_work), ROLN_MAX(ROLN_ENCODE_WORK(S, 2), ROLNI_POSE_WORK(S))), \
                       ROLN_MAX(ROLN_TRIANGLE_WORK((3 + 2 * (load)) * S(n), ROLNI_FILTER_SIDE(S, load)), \
                                ROLN_TRIANGLE_WORK(ROLNI_FILTER_SIDE(S, load) + S(N), ROLNI_FILTER_SIDE(S, load) + 1)))))
ROLN_INLINE uint32_t roln_filter_tick(const roln_trained *m, const roln_noise *noise, const roln_real *y, const roln_real *tau,
                                      const roln_estimate *e, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, load = e->load != NULL;
    roln_filter *const filter = e->filter;
    rolni_innovation in = {0, 0, 0};
    rolni_filter f;
    uint32_t faults = 0;
    int i, measured = 0;
    rolni_filter_lay(N, n, load, &f, work);
    if (!rolni_noise_valid(N, noise) || (load && (!roln_finite(noise->load) || !(noise->load >= 0)))) {
        filter->faults |= ROLN_FAULT_INPUT | ROLN_FILTER_NONE;
        return ROLN_FAULT_INPUT | ROLN_FILTER_NONE; /* the last estimate grows old */
    }
    if (tau && !roln_all_finite(roln_force_size(m->model), tau)) faults |= ROLN_FAULT_INPUT, tau = NULL;
    for (i = 0; y && i < N; i++)
        measured += roln_finite(y[i]) != 0;
    if (measured < N) faults |= ROLN_FILTER_MISSING;
    if (filter->known) {
        roln_status st;
        rolni_copy(n, e->z, f.s);
        rolni_copy(n, e->zd, f.s + n);
        if (load) rolni_copy(n, e->load, f.s + 2 * n);
        rolni_copy(f.side * f.side, e->F, f.F);
        st = rolni_filter_predict(m, noise, tau, &f);
        if (st == ROLN_OK && measured > 0) st = rolni_filter_correct(m, noise, noise->gate, y, &f, &in);
        if (st == ROLN_OK && !roln_in_range(m, 10, f.s, f.s + n)) st = ROLN_E_RANGE;
        if (st != ROLN_OK) faults |= ROLN_FAULT_STATUS, filter->known = 0;
    }
    if (in.used < in.measured) faults |= ROLN_FILTER_OUTLIER;
    filter->outliers = rolni_counted(filter->outliers, in.measured - in.used);
    if (in.used < in.measured && in.used < n) {
        if (filter->lost < noise->lost) filter->lost++;
        else filter->known = 0;
    } else if (in.used > 0) {
        filter->lost = 0;
    }
    if (!filter->known) {
        in.used = 0;
        if (measured == 0) faults |= ROLN_FILTER_NONE;
        else faults |= rolni_filter_start(m, noise, y, filter->starts && measured < N ? e->z : NULL, &f, &in);
        filter->known = (faults & ROLN_FILTER_START) != 0;
        if (!filter->known) in.used = 0; /* nor is its nis a number */
        filter->starts = rolni_counted(filter->starts, filter->known);
        filter->lost = 0;
    }
    if (filter->known) {
        if (!roln_in_range(m, 0, f.s, f.s + n)) faults |= ROLN_FAULT_RANGE;
        rolni_copy(n, f.s, e->z);
        rolni_copy(n, f.s + n, e->zd);
        if (load) rolni_copy(n, f.s + 2 * n, e->load);
        rolni_copy(f.side * f.side, f.F, e->F);
    }
    filter->used = in.used, filter->nis = in.used > 0 ? in.nis : 0;
    filter->faults |= faults;
    return faults;
}

/* One part of what a plan shall cost: sum_i weight_i (y_i - ref_i)^2 at every step, y = C x of a part x of the state. */
enum { ROLN_OF_Q, ROLN_OF_QD, ROLN_OF_Z, ROLN_OF_ZD };
typedef struct {
    int of;                  /* x: ROLN_OF_.. */
    int count;               /* outputs y; without C not read */
    const roln_real *C;      /* [count][N or n]; NULL: y = x, and angles count by the shortest turn */
    const roln_real *weight; /* [count] 0 or more: 1 / d^2, where all deviations d are equally bad */
    const roln_real *ref;    /* [count], or with moving [steps][count], row k for the end of step k */
    int moving;
    roln_real last;          /* at the last step the weights are 1 + last times as large */
} roln_term;

/* What a plan is for, with the limits that a guard will hold it to. */
typedef struct {
    roln_real dt; /* a step, s: as long as u is held */
    int terms;
    const roln_term *term;
    const roln_real *u;        /* [motors] cost u_j (tau_j - hold_j)^2, 1/(Nm)^2, above 0 */
    const roln_real *hold;     /* [motors] what the motors give when nothing is to be done; NULL: 0 */
    const roln_limits *limits; /* of motors, tau, tau_each, rate, rate_each, margin; all others have to make sense, too */
    /* what follows may be left out */
    int iterations;            /* of roln_ocp_solve; 0: 6, with limits of rate 8 */
    const roln_real *P, *end;  /* cost of all that comes after the last step, (s - end)^T P (s - end), of roln_lqr say: [2n][2n],
                                  [2n] = [z; zd]; NULL: none */
    const roln_real *load;     /* [n] constant force on z, J, that plans count on, of a filter say; NULL: none */
} roln_goal;

/* State of a plan, zero-initialised: there is none. */
typedef struct {
    int known;      /* 1: there is a plan */
    int age;        /* steps since it was made: calls of roln_plan_next since then, all of which failed */
    roln_real cost; /* of it, as the model expects */
    roln_real gap;  /* of roln_ocp_solve, whose solution the plan is, or a part of the way to it: the cost of the linearised goal is
                       at most that much above the least. Much of `cost`, call after call: more iterations, or too few digits */
} roln_plan;

/* A plan and where its numbers are: states s [steps + 1][2n] = [z; zd], torques u [steps][motors], K [steps][motors][2n]. */
typedef struct {
    roln_plan *plan;
    int steps, motors;
    roln_real *s, *u, *K;
} roln_planned;

/* Largest number of iterations. */
#define ROLN_PLAN_ITERATIONS 64

/* Status of a goal: ROLN_E_LENGTH: sizes, motors; ROLN_E_NOT_FINITE; ROLN_E_NOT_SPD: a weight; ROLN_E_RANGE: dt, limits.
   L [2n][2n] is written. */
ROLN_INLINE roln_status rolni_goal_check(const roln_trained *m, const roln_goal *g, const roln_planned *pl, roln_real *L)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, motors = pl->motors;
    int i, k;
    if (!rolni_motors_valid(m->model, g->limits->motors)) return ROLN_E_LENGTH;
    if (motors != rolni_torques(m->model, g->limits->motors)) return ROLN_E_LENGTH;
    if (g->terms < 0 || g->iterations < 0 || g->iterations > ROLN_PLAN_ITERATIONS) return ROLN_E_LENGTH;
    if (!(g->dt > 0) || !rolni_limits_valid(g->limits, motors)) return roln_finite(g->dt) ? ROLN_E_RANGE : ROLN_E_NOT_FINITE;
    if (g->hold && !roln_all_finite(motors, g->hold)) return ROLN_E_NOT_FINITE;
    if (g->load && !roln_all_finite(n, g->load)) return ROLN_E_NOT_FINITE;
    for (i = 0; i < motors; i++) {
        if (!(g->u[i] > 0)) return roln_finite(g->u[i]) ? ROLN_E_NOT_SPD : ROLN_E_NOT_FINITE;
        if (!(rolni_most(g->limits, i) > 0)) return ROLN_E_RANGE;
    }
    for (k = 0; k < g->terms; k++) {
        const roln_term *t = g->term + k;
        const int count = t->C ? t->count : t->of < ROLN_OF_Z ? N : n;
        if (t->of < ROLN_OF_Q || t->of > ROLN_OF_ZD || count < 0) return ROLN_E_LENGTH;
        if (!roln_all_finite(count, t->weight) || !roln_all_finite((t->moving ? pl->steps : 1) * count, t->ref) ||
            (t->C && !roln_all_finite(count * (t->of < ROLN_OF_Z ? N : n), t->C)) || !roln_finite(t->last))
            return ROLN_E_NOT_FINITE;
        for (i = 0; i < count; i++)
            if (t->weight[i] < 0 || t->last < 0) return ROLN_E_NOT_SPD;
    }
    if (!g->P) return ROLN_OK;
    return roln_all_finite(2 * n, g->end) ? rolni_goal_weighs(2 * n, g->P, L) : ROLN_E_NOT_FINITE;
}

/* What a term works on: the joints x [2N] at the state s [2n] and the gradient gx by them, J [N][n]; Q, q as in rolni_goal_at. */
#define ROLNI_GOAL_MEM(X, S) \
    X(x, 2 * S(N)) X(gx, 2 * S(N)) X(J, S(N) * S(n)) X(row, 2 * S(n)) X(tape, ROLN_AE_DECODE_TAPE(S, 2, 1))
#define ROLNI_GOAL_WORK(S) \
    (0 ROLNI_GOAL_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLNI_POSE_WORK(S), ROLN_AE_DECODE_BWD_WORK(S, 2, 1)))
typedef struct {
    const roln_real *s;
    roln_real *Q, *q;
    ROLNI_GOAL_MEM(ROLNI_FIELD, ROLNI_LOCAL)
} rolni_goal;

/* Output i of a term, off by e: to its gradient and, by way of its row of derivatives, to Q. */
ROLN_FN void rolni_goal_push(int N, int n, const roln_term *f, int i, roln_real weight, roln_real e, const rolni_goal *b)
{
    const int joints = f->of < ROLN_OF_Z, fast = f->of == ROLN_OF_QD || f->of == ROLN_OF_ZD, side = joints ? N : n;
    const roln_real *const c = f->C ? f->C + i * side : NULL;
    roln_real *const to = joints ? b->gx + fast * N : b->q + fast * n, *const Q = b->Q + fast * (2 * n + 1) * n;
    int j, k;
    for (j = 0; j < side && c; j++)
        to[j] += 2 * weight * e * c[j];
    if (!c) to[i] += 2 * weight * e;
    if (joints && c) roln_mm(1, N, n, c, b->J, b->row);
    else if (joints) rolni_copy(n, b->J + i * n, b->row);
    else if (c) rolni_copy(n, c, b->row);
    else {
        Q[i * (2 * n + 1)] += 2 * weight;
        return;
    }
    for (j = 0; j < n; j++)
        for (k = 0; k < n; k++)
            Q[j * 2 * n + k] += 2 * weight * b->row[j] * b->row[k];
}

/* The cost of all terms but the last one's, P, of state k. */
ROLN_FN roln_real rolni_goal_terms(const roln_lnn *lnn, int N, const roln_goal *g, int k, int end, const rolni_goal *b)
{
    const int n = lnn->n;
    roln_real sum = 0;
    int t, i;
    for (t = 0; t < g->terms; t++) {
        const roln_term *f = g->term + t;
        const int joints = f->of < ROLN_OF_Z, fast = f->of == ROLN_OF_QD || f->of == ROLN_OF_ZD, side = joints ? N : n;
        const int count = f->C ? f->count : side;
        const roln_real *at = (joints ? b->x : b->s) + fast * side, *ref = f->ref + (f->moving ? k * count : 0);
        for (i = 0; i < count; i++) {
            const roln_real w = f->weight[i] * (end ? 1 + f->last : 1), y = f->C ? roln_dot(side, f->C + i * side, at) : at[i];
            const roln_real e = y - (f->C || fast || i >= n ? ref[i] : roln_lnn_near(lnn, i, y, ref[i]));
            if (!(w > 0)) continue;
            sum += w * e * e;
            if (b->Q) rolni_goal_push(N, n, f, i, w, e, b);
        }
    }
    return sum;
}

/* (s - end)^T P (s - end). */
ROLN_FN roln_real rolni_goal_end(const roln_lnn *lnn, const roln_goal *g, const rolni_goal *b)
{
    const int n = lnn->n;
    roln_real sum = 0;
    int i, j;
    for (i = 0; i < 2 * n; i++)
        b->row[i] = b->s[i] - (i < n ? roln_lnn_near(lnn, i, b->s[i], g->end[i]) : g->end[i]);
    for (i = 0; i < 2 * n; i++) {
        const roln_real y = roln_dot(2 * n, g->P + i * 2 * n, b->row);
        sum += b->row[i] * y;
        if (b->Q) b->q[i] += 2 * y;
        for (j = 0; j < 2 * n && b->Q; j++)
            b->Q[i * 2 * n + j] += 2 * g->P[i * 2 * n + j];
    }
    return sum;
}

/* What a plan is made of: a base s0 [steps + 1][2n] under u0 [steps][motors], derivatives A, B, Q, q along it, what roln_ocp_solve
   makes of them, u, x, K, and what comes of that, s1 under u1. top, rate, last, hold, r [motors]: limits, a change of torque in a
   step, the torque before the first step, what the goal holds, twice its weight. */
#define ROLN_PLAN_MEM(X, S) \
    X(s0, (S(steps) + 1) * 2 * S(n)) X(s1, (S(steps) + 1) * 2 * S(n)) X(x, (S(steps) + 1) * 2 * S(n)) \
    X(u0, S(steps) * S(motors)) X(u1, S(steps) * S(motors)) X(u, S(steps) * S(motors)) \
    X(A, S(steps) * 4 * S(n) * S(n)) X(B, S(steps) * 2 * S(n) * S(motors)) \
    X(Q, S(steps) * 4 * S(n) * S(n)) X(q, S(steps) * 2 * S(n)) X(K, S(steps) * S(motors) * 2 * S(n)) \
    X(top, S(motors)) X(rate, S(motors)) X(last, S(motors)) X(r, S(motors)) X(hold, S(motors)) X(tau, S(N))
#define ROLN_PLAN_WORK(S) \
    (0 ROLN_PLAN_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(ROLN_MAX(ROLNI_LINEAR_MOTORS_WORK(S), ROLN_STEP_WORK(S)), \
              ROLN_MAX(ROLNI_GOAL_WORK(S), ROLN_OCP_WORK(2 * S(n), S(motors), S(steps), 1))))
typedef struct {
    const roln_goal *goal;
    int motors, steps, rated;
    ROLN_PLAN_MEM(ROLNI_FIELD, ROLNI_LOCAL)
    roln_real *work;
} rolni_plan;

/* Adds to cost that of s [2n], the state behind step k; unless Q is NULL, q [2n] becomes its gradient, and Q [2n][2n] its Hessian
   but for what it owes to how decoders bend (Gauss-Newton). */
ROLN_INLINE roln_status rolni_goal_at(const roln_trained *m, const rolni_plan *plan, int k, const roln_real *s, roln_real *cost,
                                      roln_real *Q, roln_real *q)
{
    const roln_goal *g = plan->goal;
    const roln_ae *ae = &m->model->ae;
    const roln_lnn *lnn = &m->model->lnn;
    const roln_real *each = rolni_each(m->model, m);
    const int N = ae->size[0], n = lnn->n, ae_sum = roln_ae_sum(ae), curves = ae->curves, end = k == plan->steps - 1;
    roln_real *work = plan->work;
    rolni_goal goal, *const b = &goal;
    int i, joints = 0;
    ROLNI_GOAL_MEM(ROLNI_LAY, ROLNI_LOCAL)
    b->s = s, b->Q = Q, b->q = q;
    for (i = 0; i < g->terms; i++)
        joints |= g->term[i].of < ROLN_OF_Z;
    if (joints) {
        roln_status st = rolni_decode(m, s, s + n, b->x, b->tape, b->row);
        /* unreached: the state has been decoded above */
        if (st == ROLN_OK && Q) st = rolni_pose(m, s, b->gx, b->J, work); /* q, once more, is not read */
        if (st != ROLN_OK) return st; /* unreached: as above */
    }
    rolni_zero(2 * N, b->gx);
    if (Q) rolni_zero(4 * n * n, Q), rolni_zero(2 * n, q);
    *cost += rolni_goal_terms(lnn, N, g, k, end, b);
    if (end && g->P) *cost += rolni_goal_end(lnn, g, b);
    for (i = 0; i < 2 * N && Q; i++)
        b->gx[i] *= m->scale->q * (each ? each[i % N] : 1);
    if (joints && Q) roln_ae_decode_bwd(ae, 2, 1, m->theta, b->tape, b->gx, q, NULL, work);
    return roln_finite(*cost) && (!Q || (roln_all_finite(2 * n, q) && roln_all_finite(4 * n * n, Q))) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* u within limits, after last. */
ROLN_FN roln_real rolni_plan_clip(const rolni_plan *b, int j, roln_real last, roln_real u)
{
    const roln_real top = b->top[j], low = b->rated ? ROLN_MAX(-top, last - b->rate[j]) : -top;
    const roln_real high = b->rated ? ROLN_MIN(top, last + b->rate[j]) : top;
    return u < low ? low : u > high ? high : u;
}

/* u0 of step k to begin with: that of the last plan, a step on, with its feedback, or hold. */
ROLN_INLINE void rolni_plan_again(const roln_trained *m, const roln_planned *pl, int k, const rolni_plan *b)
{
    const int n = m->model->lnn.n, n2 = 2 * n, motors = b->motors, steps = b->steps, known = pl->plan->known && pl->plan->age == 0;
    const roln_real *s = b->s0 + k * n2, *planned = pl->s + (k + 1) * n2;
    int i, j;
    for (j = 0; j < motors; j++) {
        const roln_real *K = pl->K + ((k + 1) * motors + j) * n2;
        roln_real u = known ? pl->u[ROLN_MIN(k + 1, steps - 1) * motors + j] : b->hold[j];
        for (i = 0; i < n2 && known && k + 1 < steps; i++)
            u -= K[i] * ((i < n ? roln_lnn_near(&m->model->lnn, i, planned[i], s[i]) : s[i]) - planned[i]);
        b->u0[k * motors + j] = rolni_plan_clip(b, j, k > 0 ? b->u0[(k - 1) * motors + j] : b->last[j], u);
    }
}

/* The base: from s0 on under u0, with derivatives, its cost; *in: it does not leave the range. pl NULL: u0 is there. */
ROLN_INLINE roln_status rolni_plan_base(const roln_trained *m, const roln_planned *pl, const rolni_plan *b, roln_real *cost,
                                        int *in)
{
    const roln_trained driven = *m; /* a copy, whose address escapes */
    const int n = m->model->lnn.n, n2 = 2 * n, motors = b->motors;
    rolni_acting by = {b->goal->limits->motors, NULL, b->goal->load};
    int k, j;
    *cost = 0, *in = 1;
    for (k = 0; k < b->steps; k++) {
        roln_real *const s = b->s0 + (k + 1) * n2;
        roln_status st;
        if (pl) rolni_plan_again(m, pl, k, b);
        rolni_copy(n2, s - n2, s);
        by.u = b->u0 + k * motors;
        st = rolni_linear_motors(&driven, &by, s, b->goal->dt, b->A + k * n2 * n2, b->B + k * n2 * motors, b->work);
        if (st != ROLN_OK) return st;
        st = rolni_goal_at(m, b, k, s, cost, b->Q + k * n2 * n2, b->q + k * n2);
        if (st != ROLN_OK) return st;
        for (j = 0; j < motors; j++) {
            const roln_real e = b->u0[k * motors + j] - b->hold[j];
            *cost += b->r[j] / 2 * e * e;
        }
        *in &= roln_in_range(m, b->goal->limits->margin, s, s + n) != 0;
    }
    /* unreached: each step's cost is checked; their sum would have to overflow alone */
    return roln_finite(*cost) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* What becomes of a part of the step from the base, on the model and within all limits: s1 under u1. ROLN_E_RANGE: it leaves
   the range. */
ROLN_INLINE roln_status rolni_plan_try(const roln_trained *m, const rolni_plan *b, roln_real part, roln_real *cost)
{
    const roln_trained driven = *m; /* a copy, whose address escapes */
    const int N = m->model->ae.size[0], n = m->model->lnn.n, n2 = 2 * n, motors = b->motors;
    rolni_push by = {NULL, b->goal->load};
    int k, i, j;
    *cost = 0;
    rolni_copy(n2, b->s0, b->s1);
    for (k = 0; k < b->steps; k++) {
        roln_real *const s = b->s1 + (k + 1) * n2, *const u = b->u1 + k * motors;
        const roln_real *u0 = b->u0 + k * motors;
        roln_status st;
        for (j = 0; j < motors; j++) {
            roln_real to = u0[j] + part * (b->u[k * motors + j] - u0[j]);
            for (i = 0; i < n2; i++)
                to -= b->K[(k * motors + j) * n2 + i] * (s[i - n2] - b->s0[k * n2 + i] - part * b->x[k * n2 + i]);
            u[j] = rolni_plan_clip(b, j, k > 0 ? u[j - motors] : b->last[j], to);
            *cost += b->r[j] / 2 * (u[j] - b->hold[j]) * (u[j] - b->hold[j]);
        }
        rolni_copy(n2, s - n2, s);
        by.tau = rolni_motors_tau(N, b->goal->limits->motors, u, b->tau);
        st = rolni_step(&driven, s, s + n, &by, b->goal->dt, b->work);
        if (st == ROLN_OK) st = rolni_goal_at(m, b, k, s, cost, NULL, NULL);
        if (st != ROLN_OK) return st;
        if (!roln_in_range(m, b->goal->limits->margin, s, s + n)) return ROLN_E_RANGE;
    }
    /* unreached: each step's cost is checked; their sum would have to overflow alone */
    return roln_finite(*cost) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Limits and weights of the motors. Without a limit of its rate a torque may go from end to end of its own in a step. */
ROLN_FN void rolni_plan_start(const rolni_plan *b, const roln_planned *pl)
{
    const roln_limits *limits = b->goal->limits;
    const int motors = b->motors, age = pl->plan->age;
    int j;
    for (j = 0; j < motors; j++) {
        const roln_real rate = rolni_rate(limits, j), top = rolni_most(limits, j);
        b->top[j] = top;
        b->rate[j] = rate > 0 ? rate * b->goal->dt : 4 * ROLN_MIN(top, ROLN_C(1e37));
        b->r[j] = 2 * b->goal->u[j];
        b->hold[j] = b->goal->hold ? b->goal->hold[j] : 0;
        b->last[j] = pl->plan->known ? pl->u[age * motors + j] : b->hold[j];
        b->last[j] = b->last[j] > top ? top : b->last[j] < -top ? -top : b->last[j];
    }
}

/* u, x, K from the derivatives. */
ROLN_FN roln_status rolni_plan_solve(int n, const rolni_plan *b, roln_real *gap)
{
    roln_ocp p;
    p.n = 2 * n, p.m = b->motors, p.steps = b->steps;
    p.A = b->A, p.B = b->B, p.Q = b->Q, p.q = b->q, p.r = b->r, p.ref = b->hold, p.at = b->u0;
    p.rate = b->rated ? b->rate : NULL, p.last = b->last, p.most = b->top;
    return roln_ocp_solve(&p, b->goal->iterations > 0 ? b->goal->iterations : b->rated ? 8 : 6, b->u, b->x, b->K, gap, b->work);
}

/* s1, u1 from the base; where nothing costs less, the base itself. */
ROLN_INLINE roln_status rolni_plan_better(const roln_trained *m, const roln_planned *pl, const rolni_plan *b, roln_real *cost,
                                          roln_real *gap)
{
    const int n = m->model->lnn.n, n2 = 2 * n, count = b->steps * b->motors;
    roln_real before, part;
    int in;
    roln_status st = rolni_plan_base(m, pl, b, &before, &in);
    if (st == ROLN_OK) st = rolni_plan_solve(n, b, gap);
    if (st != ROLN_OK) return st;
    for (part = 1; part > ROLN_C(0.2); part /= 2)
        if (rolni_plan_try(m, b, part, cost) == ROLN_OK && (!in || *cost <= before)) return ROLN_OK;
    rolni_copy(count, b->u0, b->u1);
    rolni_copy((b->steps + 1) * n2, b->s0, b->s1);
    *cost = before;
    return in ? ROLN_OK : ROLN_E_RANGE;
}

/* The next plan, a step of dt after the last call, whether that found one or not; where a call was left out, set pl->plan->known
   to 0 before the next: torques u_k that take the state s [2n] = [z; zd] where the goal wants it, within the limits of the motors,
   at the least cost over steps of dt. It starts from the last plan with its feedback, linearises the model along it, solves what
   that gives for u (roln_ocp_solve), and lets the model move by it, with feedback; if that costs more than the last plan does, by
   half, and by a quarter of it: one iteration of Newton's method without second derivatives of the model (Gauss-Newton), with
   which the next call goes on (real-time iteration). The first plan starts from hold, and so does one after a failure. Angles of
   a plan go on from those of s without a break; an angle of s that is more than two turns from 0 is first brought within (-pi, pi].
   ROLN_OK: *pl is the new plan, or the last one, a step on, or hold, where the model finds none that is better. Else there is no
   new one: the last one has become a step older, or, at its end, is no longer known. ROLN_E_RANGE: dt, limits (a tau of 0, too:
   leave out the column of B of a motor that is off), or all ways lead out of the range seen in training (limits->margin);
   ROLN_E_LENGTH: sizes, motors; ROLN_E_NOT_SPD: weights, or too far apart for the digits of the solver;
   ROLN_E_NOT_FINITE, of other numbers; status of roln_linear, roln_ocp_solve. A limit of torque that is never reached may be any
   finite number. It changes a plan by rounding only, and so does another unit of a motor (test_plan.c: test_far, test_motor_units).
   Numbers that goal points to stay as they are during the call. Cost: steps times
   roln_linear, one to three times roln_step, and roln_ocp_solve. work [ROLN_PLAN_WORK]. */
ROLN_INLINE roln_status roln_plan_next(const roln_trained *m, const roln_goal *goal, const roln_real *s, const roln_planned *pl,
                                       roln_real *work)
{
    const int n = m->model->lnn.n, n2 = 2 * n, steps = pl->steps, motors = pl->motors;
    const int N = m->model->ae.size[0];
    roln_status st;
    rolni_plan plan, *const b = &plan;
    roln_real cost = 0, gap = 0;
    ROLN_PLAN_MEM(ROLNI_LAY, ROLNI_LOCAL)
    b->goal = goal, b->steps = steps, b->motors = motors, b->work = work;
    b->rated = goal->limits->rate > 0 || goal->limits->rate_each;
    st = rolni_goal_check(m, goal, pl, b->A);
    if (st == ROLN_OK && !roln_all_finite(n2, s)) st = ROLN_E_NOT_FINITE;
    if (st == ROLN_OK) {
        rolni_copy(n2, s, b->s0);
        rolni_turn_back(&m->model->lnn, 1, b->s0);
        rolni_plan_start(b, pl);
        st = rolni_plan_better(m, pl, b, &cost, &gap);
    }
    if (st != ROLN_OK) {
        if (pl->plan->known && ++pl->plan->age >= steps) pl->plan->known = pl->plan->age = 0;
        return st;
    }
    rolni_copy(steps * motors, b->u1, pl->u);
    rolni_copy(steps * motors * n2, b->K, pl->K);
    rolni_copy((steps + 1) * n2, b->s1, pl->s);
    pl->plan->known = 1, pl->plan->age = 0, pl->plan->cost = cost, pl->plan->gap = gap;
    return ROLN_OK;
}

/* The torque of motor j a part f of a step after step k of a plan, at the state s [2n], limited; NaN if that is no number. */
ROLN_FN roln_real rolni_plan_want(const roln_lnn *lnn, const roln_goal *goal, const roln_planned *pl, int k, roln_real f, int j,
                                  const roln_real *s)
{
    const int n = lnn->n;
    const roln_real *from = pl->s + k * 2 * n, *to = from + 2 * n, *K = pl->K + (k * pl->motors + j) * 2 * n;
    const roln_real top = rolni_most(goal->limits, j), dt = goal->dt, r = 1 - f;
    roln_real want = pl->u[k * pl->motors + j];
    int i;
    for (i = 0; i < n; i++) {
        const roln_real h0 = from[i], h1 = to[i], v0 = dt * from[n + i], v1 = dt * to[n + i];
        const roln_real z = h0 + f * f * (3 - 2 * f) * (h1 - h0) + f * r * (r * v0 - f * v1);
        want -= K[i] * (roln_lnn_near(lnn, i, z, s[i]) - z);
        want -= K[n + i] * (s[n + i] - (r * from[n + i] + f * to[n + i]));
    }
    return want < -top ? -top : want > top ? top : want;
}

/* The torques u [motors] t seconds after the last call of roln_plan_next, at the measured state s [2n]:
       u = u_k - K_k (s - s_k(t)),   s_k(t) between s_k and s_k+1 (z by cubic Hermite polynomials, zd linearly)
   within limits->tau, but not limits->rate, by which u_k comes at once. ROLN_E_LENGTH: there is no plan, or it ends before t;
   ROLN_E_RANGE: dt, limits; ROLN_E_NOT_FINITE. Then u is untouched, and the guard is to be told so (want = NULL). No work. */
ROLN_INLINE roln_status roln_plan_follow(const roln_trained *m, const roln_goal *goal, const roln_planned *pl, roln_real t,
                                         const roln_real *s, roln_real *u)
{
    const roln_lnn *lnn = &m->model->lnn;
    const roln_real at = t / goal->dt + ROLNI_AS(roln_real, pl->plan->age);
    int j, k;
    if (!(goal->dt > 0) || !roln_finite(goal->dt) || !rolni_limits_valid(goal->limits, pl->motors)) return ROLN_E_RANGE;
    if (!pl->plan->known || !(at >= 0) || !(at < ROLNI_AS(roln_real, pl->steps))) return ROLN_E_LENGTH;
    if (!roln_all_finite(2 * lnn->n, s)) return ROLN_E_NOT_FINITE;
    k = ROLNI_AS(int, at);
    for (j = 0; j < pl->motors; j++)
        if (!roln_finite(rolni_plan_want(lnn, goal, pl, k, at - ROLNI_AS(roln_real, k), j, s))) return ROLN_E_NOT_FINITE;
    for (j = 0; j < pl->motors; j++)
        u[j] = rolni_plan_want(lnn, goal, pl, k, at - ROLNI_AS(roln_real, k), j, s);
    return ROLN_OK;
}

/* The plan as others' solvers take it, s_k+1 = A_k s_k + B_k u_k + c_k: A [steps][2n][2n], B [steps][2n][motors], c [steps][2n], by
   rows, exact about the plan; joints' angles on the turns of the plan. ROLN_E_LENGTH: there is no plan, or motors;
   ROLN_E_NOT_FINITE: B or c; status of roln_linear; then they hold no result. work [ROLN_PLAN_LINEAR_WORK]. */
#define ROLN_PLAN_LINEAR_MEM(X, S) X(s, 2 * S(n))
#define ROLN_PLAN_LINEAR_WORK(S) (0 ROLN_PLAN_LINEAR_MEM(ROLNI_SIZE, S) + ROLNI_LINEAR_MOTORS_WORK(S))
ROLN_INLINE roln_status roln_plan_linear(const roln_trained *m, const roln_goal *goal, const roln_planned *pl, roln_real *A,
                                         roln_real *B, roln_real *c, roln_real *work)
{
    const int n = m->model->lnn.n, n2 = 2 * n, motors = pl->motors;
    const roln_motors *f = goal->limits->motors;
    rolni_acting by = {f, NULL, goal->load};
    int k, i;
    ROLN_PLAN_LINEAR_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (!pl->plan->known || !rolni_motors_valid(m->model, f) || motors != rolni_torques(m->model, f)) return ROLN_E_LENGTH;
    for (k = 0; k < pl->steps; k++, A += n2 * n2, B += n2 * motors, c += n2) {
        const roln_real *u = pl->u + k * motors, *x = pl->s + k * n2;
        roln_status st;
        rolni_copy(n2, x, s), by.u = u;
        if ((st = rolni_linear_motors(m, &by, s, goal->dt, A, B, work)) != ROLN_OK) return st;
        for (i = 0; i < n2; i++)
            c[i] = s[i] - roln_dot(n2, A + i * n2, x) - roln_dot(motors, B + i * motors, u);
        if (!roln_all_finite(n2 * motors, B) || !roln_all_finite(n2, c)) return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}

/* ---- 7 a training sample ---------------------------------------------------------------------- */

/* A sample is encoded (roln_ae_encode), stepped (roln_lnn_step), decoded (roln_ae_decode) and compared with the data, and from
   there it goes back through the same stations in reverse, each of which computes its forward once more: rolni_samples_forward and
   rolni_samples_backward for the acceleration loss of single samples, rolni_windows_forward and rolni_windows_backward for windows
   of several steps. */

/* Windows of recorded motion. Window w has samples start[w] + h stride, h = 0 .. steps, of the arrays. */
typedef struct {
    int count, steps;        /* windows; steps of each (0 in the acceleration loss) */
    int stride;              /* samples per step, 1 or more */
    const int *start;        /* [count] first sample of each window; NULL: they follow each other */
    const roln_real *q, *qd; /* [samples][N]; qd NULL: positions only, the ODE loss becomes the variational loss */
    const roln_real *qdd;    /* [samples][N], acceleration loss only */
    const roln_real *tau;    /* [samples][roln_force_size] held from each sample to the next (mean over a step); NULL: none */
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
   with the number of windows. NULL: the sums are plain. */
typedef struct rolni_gradient {
    roln_real *ae, *net;
    roln_loss *loss;
    roln_real *windows;
    uint64_t *signs;
    roln_real *residual;
    const struct rolni_gradient *rest;
} roln_gradient;

/* The gradient by all parameters, theta [roln_params]. */
ROLN_FN roln_gradient roln_gradient_of(const roln_model *md, roln_real *theta, roln_loss *loss, roln_real *windows)
{
    roln_gradient g;
    g.ae = theta, g.net = theta + roln_ae_params(&md->ae), g.loss = loss, g.windows = windows;
    g.signs = NULL, g.residual = NULL, g.rest = NULL;
    return g;
}

/* Where the blocks of windows go: to what is folded after ROLNI_PARTS of them, and at the end. */
#define ROLNI_PARTS 64
ROLN_FN const roln_gradient *rolni_part_to(const roln_gradient *g)
{
    return g->rest ? g->rest : g;
}

ROLN_FN void rolni_gradient_fold(const roln_model *md, const roln_gradient *g)
{
    enum { ROLNI_TERMS = sizeof(roln_loss) / sizeof(roln_real) };
    const int ae_size = roln_ae_params(&md->ae);
    const roln_gradient *r = g->rest;
    roln_real sum[ROLNI_TERMS], rest[ROLNI_TERMS];
    if (!r) return;
    rolni_fold(ae_size, g->ae, r->ae);
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

/* b [nb][n]: of each angle those of its turns that are next to a [nb][n]; all else stays. */
ROLNI_INLINE void rolni_next_to(const roln_lnn *f, int nb, const roln_real *a, roln_real *b)
{
    int i;
    for (i = 0; f->angles && i < nb * f->n; i++) /* unreached: it is called with angles */
        b[i] = roln_lnn_near(f, i % f->n, a[i], b[i]);
}

/* The gradients that a force gives go there, too. */
ROLN_INLINE void rolni_drive_to(const roln_gradient *g, rolni_driven *d)
{
    const roln_model *md = d->torque.m->model;
    d->force.bwd = rolni_torque_bwd;
    d->torque.gae = g->ae;
    d->torque.gB = g->net ? g->net + roln_lnn_params(&md->lnn) : NULL;
}

/* The arrays of a block of nb windows that live as long as it does, and those that its stations take one after the other. */
#define ROLNI_WINDOWS_MEM(X, S, nb, H, size) \
    X(Z, 2 * ((H) + 1) * (nb) * S(n)) /* encoded samples [H+1][2][nb][n] */ \
    X(P, 2 * ((H) + 1) * (nb) * S(n)) /* predicted */ \
    X(gZ, 2 * (nb) * S(n)) /* cotangents of an encoded sample, of a predicted one, and of the one before */ \
    X(gP, 2 * (nb) * S(n)) \
    X(gB, 2 * (nb) * S(n)) \
    X(x, 2 * (nb) * S(N)) /* data [2][nb][N] */ \
    X(held, (nb) * (size)) /* force */ \
    X(tape, ROLN_AE_ENCODE_TAPE(S, 2, nb))
#define ROLNI_DECODED_MEM(X, S, jets, nb) /* what decoding and comparing takes, [jets][data and prediction][nb] */ \
    X(D, 2 * (jets) * (nb) * S(n)) \
    X(Y, 2 * (jets) * (nb) * S(N)) \
    X(gY, 2 * (jets) * (nb) * S(N)) \
    X(tape, ROLN_AE_DECODE_TAPE(S, jets, 2 * (nb)))
#define ROLNI_STEPPED_MEM(X, S, nb, tape_size) X(next, 2 * (nb) * S(n)) X(tapes, tape_size) /* what a step and its backward take */
/* Tapes and work, for a block of nb, of a step of the model, of the midpoint rule, which the variational loss takes, of a start,
   and of the stations of the acceleration loss. ROLN_GRAD_WORK, ROLN_GRAD_ACC_WORK and ROLN_ERRORS_WORK ask S for these sizes by
   their names. (S(scheme) + 0 is an int, to be compared.) */
#define ROLNI_KEPT_TAPES(S, scheme, nb) (ROLN_STAGES(scheme) * ROLN_LNN_TAPE(S, 1, 1, nb))
#define ROLN_GRAD_STEPS(X, S, nb) \
    X(step_kept, ROLNI_KEPT_TAPES(S, (S(scheme) + 0), nb) + ROLN_LNN_STEP_WORK(S, (S(scheme) + 0), 1, nb)) \
    X(step_bwd, ROLNI_KEPT_TAPES(S, (S(scheme) + 0), nb) + ROLN_LNN_STEP_BWD_WORK(S, (S(scheme) + 0), nb)) \
    X(mid_kept, ROLNI_KEPT_TAPES(S, ROLN_MIDPOINT, nb) + ROLN_LNN_STEP_WORK(S, ROLN_MIDPOINT, 1, nb)) \
    X(mid_bwd, ROLNI_KEPT_TAPES(S, ROLN_MIDPOINT, nb) + ROLN_LNN_STEP_BWD_WORK(S, ROLN_MIDPOINT, nb)) \
    X(start_kept, ROLNI_KEPT_TAPES(S, ROLN_MIDPOINT, nb) + ROLN_LNN_START_WORK(S, 1, nb)) \
    X(start_bwd, ROLNI_KEPT_TAPES(S, ROLN_MIDPOINT, nb) + ROLN_LNN_START_BWD_WORK(S, nb)) \
    X(step_once, ROLN_LNN_TAPE(S, 1, 0, nb) + ROLN_LNN_STEP_WORK(S, (S(scheme) + 0), 0, nb)) \
    X(mid_once, ROLN_LNN_TAPE(S, 1, 0, nb) + ROLN_LNN_STEP_WORK(S, ROLN_MIDPOINT, 0, nb)) \
    X(start_once, ROLN_LNN_TAPE(S, 1, 0, nb) + ROLN_LNN_START_WORK(S, 0, nb)) \
    X(stage_kept, ROLNI_STAGE_WORK(S, 1, nb)) X(stage_bwd, ROLNI_STAGE_BWD_WORK(S, nb)) \
    X(inverse_kept, ROLN_LNN_INVERSE_WORK(S, 1, 1, nb)) X(inverse_bwd, ROLN_LNN_INVERSE_BWD_WORK(S, nb))
#define ROLNI_STEPPED_WORK(S, nb) \
    (ROLNI_FORCE_WORK(S, nb, 1) + \
     ROLN_MAX((0 ROLNI_STEPPED_MEM(ROLNI_SIZE, S, nb, 0)) + \
                  ROLN_MAX(ROLN_MAX(ROLN_MAX(S(step_kept), S(step_bwd)), ROLN_MAX(S(mid_kept), S(mid_bwd))), \
                           ROLN_MAX(S(start_kept), S(start_bwd))), \
              ROLN_MAX(ROLN_MAX(S(step_once), S(mid_once)), S(start_once))))
#define ROLN_GRAD_WORK(S, nb, H) \
    (0 ROLNI_WINDOWS_MEM(ROLNI_SIZE, S, nb, H, S(force_size)) + \
     ROLN_MAX(ROLNI_STEPPED_WORK(S, nb), \
              ROLN_MAX((0 ROLNI_DECODED_MEM(ROLNI_SIZE, S, 2, nb)) + ROLN_AE_DECODE_BWD_WORK(S, 2, 2 * (nb)), \
                       ROLN_AE_ENCODE_BWD_WORK(S, 2, nb))))
/* A block of nb windows from window w0 on its way through the stations. */
typedef struct {
    const roln_trained *m;
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
    rolni_driven drive;
    ROLNI_WINDOWS_MEM(ROLNI_FIELD, ROLNI_LOCAL, nb, H, size)
    roln_real *work, *behind; /* what is left of work, and of that what is behind the force's */
} rolni_windows;

ROLN_INLINE void rolni_windows_start(const roln_trained *m, const roln_loss *wt, const roln_batch *batch, roln_real dt,
                                     const roln_gradient *g, rolni_windows *b, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n, N1 = roln_ae_size(ae, 1), ae_sum = roln_ae_sum(ae);
    const int H = batch->steps, nb = b->nb;
    b->m = m, b->weights = wt, b->batch = batch, b->g = g;
    b->h = dt / m->scale->t;
    b->scheme = batch->qd ? m->model->scheme : ROLN_MIDPOINT;
    b->jets = batch->qd ? 2 : 1;
    b->first = batch->qd ? 1 : 2;
    b->each = 1 / ROLNI_AS(roln_real, H + 1), b->step = 1 / ROLNI_AS(roln_real, ROLN_MAX(H - b->first + 1, 1));
    b->rollout = H >= b->first && (wt->z > 0 || wt->zd > 0 || wt->q_pred > 0 || wt->qd_pred > 0);
    ROLNI_WINDOWS_MEM(ROLNI_LAY, ROLNI_LOCAL, nb, H, roln_force_size(m->model))
    b->work = work;
    b->behind = work + rolni_torque_work(m->model, nb, 1);
    rolni_drive(m, batch->tau ? b->held : NULL, &b->drive, work);
    rolni_drive_to(g, &b->drive);
}

/* The data of step k, scaled, to x. */
ROLN_FN void rolni_windows_data(const roln_model *md, const rolni_windows *b, int k)
{
    const roln_scale *sc = b->m->scale;
    const roln_real *each = rolni_each(md, b->m);
    const int N = md->ae.size[0];
    rolni_gather(b->batch, b->batch->q, N, b->w0, b->nb, k, 1 / sc->q, b->x);
    if (b->batch->qd) rolni_gather(b->batch, b->batch->qd, N, b->w0, b->nb, k, rolni_velocity_unit(sc), b->x + b->nb * N);
    rolni_divide_each(b->jets * b->nb, N, each, b->x);
    rolni_turn_back(&md->lnn, b->nb, b->x);
}

/* The force that is held from step k to k + 1, the mean over its samples, scaled, to held. */
ROLN_FN void rolni_windows_force(const roln_model *md, const rolni_windows *b, int k)
{
    const roln_scale *sc = b->m->scale;
    const int size = roln_force_size(md);
    if (!b->batch->tau) return;
    rolni_gather_tau(b->batch, size, b->w0, b->nb, k, rolni_force_unit(sc), b->held);
    rolni_multiply_each(b->nb, size, rolni_each_force(md, b->m), b->held);
}

/* Forward: encode every sample and roll out from the first (two). Only the states Z and P are kept. */
ROLN_FN roln_status rolni_windows_forward(const roln_model *md, const rolni_windows *b)
{
    const int n = md->lnn.n, nb = b->nb, nz = nb * n;
    roln_real *tape = b->behind, *work = tape + roln_lnn_tape(&md->lnn, 1, 0, nb);
    int k;
    for (k = 0; k <= b->batch->steps; k++) {
        roln_real *Zk = b->Z + k * 2 * nz, *Pk = b->P + k * 2 * nz;
        roln_status st = ROLN_OK;
        rolni_windows_data(md, b, k);
        roln_ae_encode(&md->ae, b->jets, nb, b->m->theta, b->x, Zk, b->tape);
        if (!roln_all_finite(b->jets * nz, Zk)) return ROLN_E_NOT_FINITE;
        if (k == 0) rolni_copy(b->jets * nz, Zk, Pk);
        if (k == 0 || !b->rollout) continue;
        rolni_windows_force(md, b, k - 1);
        if (k < b->first) st = roln_lnn_start(&md->lnn, &b->drive.sys, 0, nb, b->h, Zk - 2 * nz, Zk, Pk, tape, work);
        else st = roln_lnn_step(&md->lnn, &b->drive.sys, b->scheme, 0, nb, b->h, Pk - 2 * nz, Pk, tape, work);
        if (st != ROLN_OK) return st;
    }
    return ROLN_OK;
}

/* Sample k decoded, its reconstruction beside its prediction (pred: there is one), both compared with the data, and back to z:
   gZ is set, gP is added to. */
ROLN_FN void rolni_windows_decode(const roln_model *md, const rolni_windows *b, int k, int pred, roln_real *gP)
{
    const roln_loss *wt = b->weights;
    const int N = md->ae.size[0], n = md->lnn.n, nb = b->nb, nz = nb * n, nx = nb * N;
    const int ae_sum = roln_ae_sum(&md->ae), curves = md->ae.curves, rows = pred ? 2 * nb : nb;
    const roln_real *Zk = b->Z + k * 2 * nz, *Pk = b->P + k * 2 * nz, *x = b->x;
    roln_loss *loss = b->g->loss;
    roln_real *work = b->work;
    ROLNI_DECODED_MEM(ROLNI_CARVE, ROLNI_LOCAL, b->jets, nb)
    int p, i;
    for (p = 0; p < b->jets; p++) {
        rolni_copy(nz, Zk + p * nz, D + p * rows * n);
        if (pred) rolni_copy(nz, Pk + p * nz, D + p * rows * n + nz);
    }
    roln_ae_decode(&md->ae, b->jets, rows, b->m->theta, D, Y, tape);
    rolni_zero(b->jets * rows * N, gY);
    rolni_zero(b->jets * rows * n, D); /* from here on the cotangents of what was decoded */
    rolni_compare(b->g, rolni_term_of(b->each, wt->q, &loss->q), nx, Y, x, gY, NULL);
    if (md->lnn.angles && pred) rolni_next_to(&md->lnn, nb, Y + nx, b->x);
    if (pred) rolni_compare(b->g, rolni_term_of(b->step, wt->q_pred, &loss->q_pred), nx, Y + nx, x, gY + nx, NULL);
    if (b->jets > 1) {
        rolni_compare(b->g, rolni_term_of(b->each, wt->qd, &loss->qd), nx, Y + rows * N, x + nx, gY + rows * N, NULL);
        if (pred)
            rolni_compare(b->g, rolni_term_of(b->step, wt->qd_pred, &loss->qd_pred), nx, Y + rows * N + nx, x + nx,
                          gY + rows * N + nx, NULL);
    }
    if (!rolni_goes_back(b->g)) return;
    roln_ae_decode_bwd(&md->ae, b->jets, rows, b->m->theta, tape, gY, D, b->g->ae, work);
    for (p = 0; p < b->jets; p++) {
        rolni_copy(nz, D + p * rows * n, b->gZ + p * nz);
        for (i = 0; pred && i < nz; i++)
            gP[p * nz + i] += D[p * rows * n + nz + i];
    }
}

/* The step, or the start, that led to sample k, and back: gP of sample k becomes gB of the one before; gZ is added to. */
ROLN_FN void rolni_windows_step(const roln_model *md, const rolni_windows *b, int k, int pred, roln_real *gP, roln_real *gB)
{
    const int n = md->lnn.n, nb = b->nb, nz = nb * n, stages = ROLN_STAGES(b->scheme);
    const roln_real *Pk = b->P + k * 2 * nz;
    roln_real *const Zk = b->Z + k * 2 * nz, *work = b->behind;
    ROLNI_STEPPED_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb, stages * roln_lnn_tape(&md->lnn, 1, 1, nb))
    rolni_zero(2 * nz, gB);
    rolni_windows_force(md, b, k - 1);
    if (!pred) { /* the start from two positions */
        if (!rolni_goes_back(b->g)) return;
        (void)roln_lnn_start(&md->lnn, &b->drive.sys, 1, nb, b->h, Zk - 2 * nz, Zk, next, tapes, work);
        roln_lnn_start_bwd(&md->lnn, &b->drive.sys, nb, b->h, gP, gB, b->gZ, b->g->net, tapes, work);
        return;
    }
    if (md->lnn.angles) rolni_next_to(&md->lnn, nb, Pk, Zk);
    rolni_compare(b->g, rolni_term_of(b->step, b->weights->z, &b->g->loss->z), nz, Pk, Zk, gP, b->gZ);
    if (b->jets > 1)
        rolni_compare(b->g, rolni_term_of(b->step, b->weights->zd, &b->g->loss->zd), nz, Pk + nz, Zk + nz, gP + nz, b->gZ + nz);
    if (!rolni_goes_back(b->g)) return;
    (void)roln_lnn_step(&md->lnn, &b->drive.sys, b->scheme, 1, nb, b->h, Pk - 2 * nz, next, tapes, work);
    roln_lnn_step_bwd(&md->lnn, &b->drive.sys, b->scheme, nb, b->h, gP, gB, b->g->net, tapes, work);
}

/* Backward, last sample first: decode, compare, one step back, encode. Each station recomputes its forward, so memory grows with H
   by the states only. */
ROLN_FN void rolni_windows_backward(const roln_model *md, const rolni_windows *b)
{
    const roln_ae *ae = &md->ae;
    const int nb = b->nb, nz = nb * md->lnn.n;
    roln_real *gP = b->gP, *gB = b->gB, *swap;
    int k, i;
    rolni_zero(2 * nz, gP);
    for (k = b->batch->steps; k >= 0; k--) {
        const int pred = b->rollout && k >= b->first;
        rolni_windows_data(md, b, k);
        rolni_windows_decode(md, b, k, pred, gP);
        if (b->rollout && k > 0) {
            rolni_windows_step(md, b, k, pred, gP, gB);
            swap = gP, gP = gB, gB = swap;
        }
        for (i = 0; b->rollout && k == 0 && i < b->jets * nz; i++) /* the roll-out began at the encoded sample */
            b->gZ[i] += gP[i];
        if (!b->g->ae) continue;
        roln_ae_encode(ae, b->jets, nb, b->m->theta, b->x, gB, b->tape); /* for its tape; gB is scratch here */
        roln_ae_encode_bwd(ae, b->jets, nb, b->m->theta, b->tape, b->gZ, NULL, b->g->ae, b->work);
    }
}

/* A block of nb samples of the acceleration loss on its way. */
#define ROLNI_SAMPLES_MEM(X, S, nb, size) \
    X(Z, 3 * (nb) * S(n)) /* encoded [3][nb][n], and its cotangent */ \
    X(gZ, 3 * (nb) * S(n)) \
    X(sd, 2 * (nb) * S(n)) /* zd, zdd_pred */ \
    X(gsd, 2 * (nb) * S(n)) \
    X(tau, 2 * (nb) * S(n)) /* tau_z of inverse dynamics, of the data */ \
    X(gtau, 2 * (nb) * S(n)) \
    X(x, 3 * (nb) * S(N)) /* data [3][nb][N] */ \
    X(held, (nb) * (size)) /* force */ \
    X(tape, ROLN_AE_ENCODE_TAPE(S, 3, nb))
#define ROLN_GRAD_ACC_WORK(S, nb) \
    (0 ROLNI_SAMPLES_MEM(ROLNI_SIZE, S, nb, S(force_size)) + \
     ROLN_MAX(ROLN_AE_ENCODE_BWD_WORK(S, 3, nb), \
              ROLNI_FORCE_WORK(S, nb, 1) + ROLN_LNN_TAPE(S, 1, 1, nb) + \
                  ROLN_MAX((0 ROLNI_DECODED_MEM(ROLNI_SIZE, S, 3, nb)) + ROLN_AE_DECODE_BWD_WORK(S, 3, 2 * (nb)), \
                           ROLN_MAX(ROLN_MAX(S(stage_kept), S(stage_bwd)), ROLN_MAX(S(inverse_kept), S(inverse_bwd))))))
typedef struct {
    const roln_trained *m;
    const roln_loss *weights;
    const roln_batch *batch;
    const roln_gradient *g;
    int w0, nb;
    rolni_driven drive;
    ROLNI_SAMPLES_MEM(ROLNI_FIELD, ROLNI_LOCAL, nb, size)
    roln_real *lnn_tape, *work;
} rolni_samples;

/* Forward: encode, and the accelerations of the model. */
ROLN_FN roln_status rolni_samples_forward(const roln_model *md, const rolni_samples *b)
{
    const roln_scale *sc = b->m->scale;
    const int N = md->ae.size[0], nb = b->nb, nx = nb * N, nz = nb * md->lnn.n, size = roln_force_size(md);
    const roln_real v = rolni_velocity_unit(sc);
    roln_status st = ROLN_OK;
    rolni_gather(b->batch, b->batch->q, N, b->w0, nb, 0, 1 / sc->q, b->x);
    rolni_gather(b->batch, b->batch->qd, N, b->w0, nb, 0, v, b->x + nx);
    rolni_gather(b->batch, b->batch->qdd, N, b->w0, nb, 0, v * sc->t, b->x + 2 * nx);
    rolni_divide_each(3 * nb, N, rolni_each(md, b->m), b->x);
    roln_ae_encode(&md->ae, 3, nb, b->m->theta, b->x, b->Z, b->tape);
    if (!roln_all_finite(3 * nz, b->Z)) return ROLN_E_NOT_FINITE;
    if (b->batch->tau) {
        rolni_gather(b->batch, b->batch->tau, size, b->w0, nb, 0, rolni_force_unit(sc), b->held);
        rolni_multiply_each(nb, size, rolni_each_force(md, b->m), b->held);
    }
    if (b->weights->force > 0) /* only its status */
        st = roln_lnn_inverse(&md->lnn, 1, nb, b->drive.sys.theta, b->Z, NULL, b->Z + 2 * nz, b->tau, b->lnn_tape, b->work);
    /* unreached: the status of an overflow in the inverse dynamics */
    return st == ROLN_OK ? rolni_stage(&md->lnn, &b->drive.sys, 1, nb, b->Z, b->sd, b->lnn_tape, b->work) : st;
}

/* Reconstruction z, zd, zdd and prediction z, zd, zdd_pred decoded, compared with the data, and back: gZ and gsd are set. */
ROLN_FN void rolni_samples_decode(const roln_model *md, const rolni_samples *b)
{
    const roln_loss *wt = b->weights;
    const int N = md->ae.size[0], n = md->lnn.n, nb = b->nb, nz = nb * n, nx = nb * N;
    const int ae_sum = roln_ae_sum(&md->ae), curves = md->ae.curves;
    const roln_real *x = b->x;
    roln_loss *loss = b->g->loss;
    roln_real *work = b->work;
    ROLNI_DECODED_MEM(ROLNI_CARVE, ROLNI_LOCAL, 3, nb)
    int p, i;
    for (p = 0; p < 3; p++) {
        rolni_copy(nz, b->Z + p * nz, D + 2 * p * nz);
        rolni_copy(nz, p < 2 ? b->Z + p * nz : b->sd + nz, D + 2 * p * nz + nz);
    }
    roln_ae_decode(&md->ae, 3, 2 * nb, b->m->theta, D, Y, tape);
    rolni_zero(6 * nx, gY);
    rolni_zero(6 * nz, D); /* from here on the cotangents of what was decoded */
    rolni_compare(b->g, rolni_term_of(1, wt->q, &loss->q), nx, Y, x, gY, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qd, &loss->qd), nx, Y + 2 * nx, x + nx, gY + 2 * nx, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qdd, &loss->qdd), nx, Y + 4 * nx, x + 2 * nx, gY + 4 * nx, NULL);
    rolni_compare(b->g, rolni_term_of(1, wt->qdd_pred, &loss->qdd_pred), nx, Y + 5 * nx, x + 2 * nx, gY + 5 * nx, NULL);
    if (!rolni_goes_back(b->g)) return;
    roln_ae_decode_bwd(&md->ae, 3, 2 * nb, b->m->theta, tape, gY, D, b->g->ae, work);
    for (p = 0; p < 3; p++)
        for (i = 0; i < nz; i++)
            b->gZ[p * nz + i] = D[2 * p * nz + i] + (p < 2 ? D[2 * p * nz + nz + i] : 0);
    rolni_zero(nz, b->gsd);
    rolni_copy(nz, D + 5 * nz, b->gsd + nz);
}

/* Backward: decode, compare in z, the accelerations, inverse dynamics, encode. */
ROLN_FN void rolni_samples_backward(const roln_model *md, const rolni_samples *b)
{
    const roln_lnn *lnn = &md->lnn;
    const roln_real *th = b->m->theta + roln_ae_params(&md->ae);
    const int nb = b->nb, nz = nb * lnn->n;
    const int back = rolni_goes_back(b->g);
    roln_real *tau = b->tau, *gtau = b->gtau;
    roln_loss *loss = b->g->loss;
    rolni_samples_decode(md, b);
    rolni_compare(b->g, rolni_term_of(1, b->weights->zdd, &loss->zdd), nz, b->sd + nz, b->Z + 2 * nz, b->gsd + nz, b->gZ + 2 * nz);
    if (back) rolni_stage_bwd(lnn, &b->drive.sys, nb, b->gsd, b->gZ, b->g->net, b->lnn_tape, b->work);
    if (b->weights->force > 0) {
        const roln_force *force = b->drive.sys.force;
        rolni_zero(nz, tau + nz);
        rolni_zero(2 * nz, gtau);
        if (force) force->eval(force->ctx, nb, b->Z, tau + nz);
        (void)roln_lnn_inverse(lnn, 1, nb, th, b->Z, NULL, b->Z + 2 * nz, tau, b->lnn_tape, b->work); /* again, for its tape */
        rolni_compare(b->g, rolni_term_of(1, b->weights->force, &loss->force), nz, tau, tau + nz, gtau, gtau + nz);
        if (!back) return;
        roln_lnn_inverse_bwd(lnn, nb, th, gtau, b->gZ, b->gZ + 2 * nz, b->g->net, b->lnn_tape, b->work);
        if (force) force->bwd(force->ctx, nb, b->Z, gtau + nz, 1, b->gZ);
    }
    if (b->g->ae) roln_ae_encode_bwd(&md->ae, 3, nb, b->m->theta, b->tape, b->gZ, NULL, b->g->ae, b->work);
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

/* A part of the samples, there and back. md is m->model, loaded before m was seen by other functions, so that it is a constant. */
ROLN_INLINE roln_status rolni_samples_block(const roln_model *md, const roln_trained *m, const roln_loss *wt,
                                            const roln_batch *batch, rolni_part part, const roln_gradient *g, roln_real *work)
{
    const int nb = part.nb, N = md->ae.size[0], n = md->lnn.n, N1 = roln_ae_size(&md->ae, 1), ae_sum = roln_ae_sum(&md->ae);
    rolni_samples block, *b = &block;
    roln_status st;
    b->m = m, b->weights = wt, b->batch = batch, b->g = g, b->w0 = part.w0, b->nb = nb;
    ROLNI_SAMPLES_MEM(ROLNI_LAY, ROLNI_LOCAL, nb, roln_force_size(md))
    rolni_drive(m, batch->tau ? b->held : NULL, &b->drive, work);
    rolni_drive_to(g, &b->drive);
    b->lnn_tape = work + rolni_torque_work(md, nb, 1);
    b->work = b->lnn_tape + roln_lnn_tape(&md->lnn, 1, 1, nb);
    if ((st = rolni_samples_forward(md, b)) != ROLN_OK) return st;
    rolni_samples_backward(md, b);
    *g->windows += ROLNI_AS(roln_real, nb);
    return ROLN_OK;
}

/* A part of the windows, there and back. */
ROLN_INLINE roln_status rolni_windows_block(const roln_model *md, const roln_trained *m, const roln_loss *wt,
                                            const roln_batch *batch, roln_real dt, rolni_part part,
                                            const roln_gradient *g, roln_real *work)
{
    rolni_windows b;
    roln_status st;
    b.w0 = part.w0, b.nb = part.nb;
    rolni_windows_start(m, wt, batch, dt, g, &b, work);
    if ((st = rolni_windows_forward(md, &b)) != ROLN_OK) return st;
    rolni_windows_backward(md, &b);
    *g->windows += ROLNI_AS(roln_real, part.nb);
    return ROLN_OK;
}

/* What both gradients ask of their arguments first. */
ROLN_INLINE roln_status rolni_grad_valid(const roln_trained *m, const roln_batch *b, int nb)
{
    if (m->model->ae.storage != ROLN_FULL) return ROLN_E_SHAPE;
    if (!rolni_batch_valid(b) || nb < 1) return ROLN_E_LENGTH;
    return roln_all_finite(roln_params(m->model), m->theta) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Gradient of the acceleration loss over single samples (paper Eq. 12), nb at a time:
       |phi(rho(q)) - q|^2 + |J D qd - qd|^2 + .. of the 3-jet + |zdd_pred - zdd|^2 + |decoded zdd_pred - qdd|^2 + |inverse dynamics
   - tau_z|^2 each times its weight. The last, `force`: where known forces work against gravity and inertia it fixes M and g
   themselves, whereas zdd only knows M^-1 of them (with tau = 0 it would draw M to 0). Else as roln_grad. work
   [ROLN_GRAD_ACC_WORK]. */
ROLN_INLINE roln_status roln_grad_acc(const roln_trained *m, const roln_loss *wt, const roln_batch *batch, int nb,
                                      const roln_gradient *g, roln_real *work)
{
    const roln_model *md = m->model;
    roln_status st = rolni_grad_valid(m, batch, nb);
    rolni_part part = {0, 0};
    int added = 0;
    if (st != ROLN_OK) return st;
    if (!batch->qd || !batch->qdd) return ROLN_E_LENGTH;
    for (; part.w0 < batch->count && st == ROLN_OK; part.w0 += part.nb) {
        part = rolni_part_of(batch, part.w0, nb);
        st = rolni_samples_block(md, m, wt, batch, part, rolni_part_to(g), work);
        if (st == ROLN_OK && ++added % ROLNI_PARTS == 0) rolni_gradient_fold(md, g);
    }
    if (added > 0) rolni_gradient_fold(md, g);
    return st;
}

/* Gradient of the ODE loss over windows of H = b->steps steps of dt seconds (paper Eq. 13): encoder, roll-out, decoder, and
   straight back, the encoded targets not detached. Per window, with mean over its samples:
       |phi(rho(q)) - q|^2 + |J D qd - qd|^2 (h = 0..H)      |zd_pred - zd|^2 + |qd_pred - qd|^2 (h = 1..H), ...
   each times its weight of wt. Without b->qd the variational loss, of positions only: the first two start the discrete motion
   (roln_lnn_start), the midpoint rule carries it on, and the terms in z, q_pred compare h = 2..H: the discrete Euler-Lagrange
   equations as a prediction error, H >= 2. Adds the sum over windows to g->ae and g->net, the unweighted terms to g->loss (without
   the prediction terms if all their weights are 0) and the count to g->windows, nb windows at a time, with g->rest as if in twice
   the digits (held by test_sums.c); a block of windows that fails
   (data or parameters not finite, eigenvalues out of range) adds nothing and ends the call. A cotangent that overflows is not
   looked for here: the update refuses it. Status of roln_lnn_step, ROLN_E_NOT_FINITE; ROLN_E_LENGTH: count or steps negative,
   stride below 1, no qd or qdd for the acceleration loss, H < 2 for a prediction from positions. ROLN_E_SHAPE: weights stored
   small can not be trained. work [ROLN_GRAD_WORK]: only the states grow with H. */
ROLN_INLINE roln_status roln_grad(const roln_trained *m, const roln_loss *wt, const roln_batch *batch, roln_real dt, int nb,
                                  const roln_gradient *g, roln_real *work)
{
    const roln_model *md = m->model;
    roln_status st = rolni_grad_valid(m, batch, nb);
    rolni_part part = {0, 0};
    int added = 0;
    if (st != ROLN_OK) return st;
    if (!batch->qd && batch->steps < 2 && (wt->z > 0 || wt->q_pred > 0)) return ROLN_E_LENGTH;
    for (; part.w0 < batch->count && st == ROLN_OK; part.w0 += part.nb) {
        part = rolni_part_of(batch, part.w0, nb);
        st = rolni_windows_block(md, m, wt, batch, dt, part, rolni_part_to(g), work);
        if (st == ROLN_OK && ++added % ROLNI_PARTS == 0) rolni_gradient_fold(md, g);
    }
    if (added > 0) rolni_gradient_fold(md, g);
    return st;
}

/* What roln_rows fills: residuals r [count] and their rows J [count][columns], NULL: not wanted. columns: all parameters, or with
   behind > 0 those behind the autoencoder. The signs of row w are drawn from seed + w. */
typedef struct {
    roln_real *J, *r;
    int behind;
    uint64_t seed;
} roln_rows_to;

/* Residual rows of the same losses for Gauss-Newton (roln_newton_rows): row w, of window w, is the derivative by the parameters of
       f = sum_i xi_i sqrt(weight_i) (model - data)_i
   over all numbers i that the loss of the window compares, xi_i = +-1 at random; r_w = -f. So E r^2 is the loss of the window and
   E J^T J its Gauss-Newton matrix, at one backward a row; a window may be listed several times for several rows (Hutchinson 1990).
   Single samples with b->qdd and b->steps = 0: the acceleration loss; else windows (roln_grad). The same signs come again for the
   same seed, so that a step can be judged by its own rows. Statuses and work of roln_grad_acc or roln_grad for one window; on a
   status other than ROLN_OK J and r are scratch, and the residual of the window that failed is infinite, so that roln_newton_judge
   refuses a step that led there. */
ROLN_INLINE roln_status roln_rows(const roln_trained *m, const roln_loss *wt, const roln_batch *batch, roln_real dt,
                                  const roln_rows_to *to, roln_real *work)
{
    const roln_model *md = m->model;
    const int ae_size = roln_ae_params(&md->ae), cols = roln_params(md) - (to->behind ? ae_size : 0);
    const int acceleration = batch->qdd && batch->steps == 0;
    roln_status st = rolni_grad_valid(m, batch, 1);
    int w;
    if (st != ROLN_OK) return st;
    if (acceleration ? !batch->qd : !batch->qd && batch->steps < 2 && (wt->z > 0 || wt->q_pred > 0)) return ROLN_E_LENGTH;
    for (w = 0; w < batch->count && st == ROLN_OK; w++) {
        roln_real *row = to->J ? to->J + ROLNI_AS(size_t, w) * ROLNI_AS(size_t, cols) : NULL, windows = 0;
        uint64_t signs = to->seed + ROLNI_AS(uint64_t, w);
        roln_loss aside;
        roln_gradient g;
        g.ae = to->behind ? NULL : row, g.net = !row ? NULL : to->behind ? row : row + ae_size;
        g.loss = &aside, g.windows = &windows, g.signs = &signs, g.residual = to->r + w, g.rest = NULL;
        to->r[w] = 0;
        if (row) rolni_zero(cols, row);
        st = acceleration ? rolni_samples_block(md, m, wt, batch, rolni_part_of(batch, w, 1), &g, work)
                          : rolni_windows_block(md, m, wt, batch, dt, rolni_part_of(batch, w, 1), &g, work);
        if (st != ROLN_OK) to->r[w] = rolni_real(ROLNI_INF);
    }
    return st;
}

/* ---- 8 data, charts, errors ------------------------------------------------------------------- */

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

/* Variance of the data of each loss term over the windows of b (first samples; b->qdd may be NULL), in its scaled units: of q, qd,
   qdd, and of the encoded z, zd, zdd; 1 where there are no data, and for the force. Divide the weights of a loss by it
   (roln_loss_divide) and every term counts in parts of its own variance. ROLN_E_LENGTH: no window. ROLN_E_NOT_FINITE (also for data
   at rest). var is untouched unless ROLN_OK. work [ROLN_VARIANCE_WORK]. */
#define ROLN_VARIANCE_MEM(X, S, jets) \
    X(x, (jets) * S(N)) X(z, (jets) * S(n)) X(mean, (jets) * (S(N) + S(n))) \
    X(rest, (jets) * (S(N) + S(n))) X(tape, ROLN_AE_ENCODE_TAPE(S, jets, 1))
#define ROLN_VARIANCE_WORK(S) (0 ROLN_VARIANCE_MEM(ROLNI_SIZE, S, 3))
ROLN_INLINE roln_status roln_variance(const roln_trained *m, const roln_batch *b, roln_loss *var, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n, N1 = roln_ae_size(ae, 1), ae_sum = roln_ae_sum(ae);
    const int jets = !b->qd ? 1 : !b->qdd ? 2 : 3, dim = jets * (N + n);
    const roln_real f = rolni_velocity_unit(m->scale), each = 1 / ROLNI_AS(roln_real, ROLN_MAX(b->count, 1));
    const roln_lnn *lnn = &m->model->lnn;
    ROLN_VARIANCE_MEM(ROLNI_CARVE, ROLNI_LOCAL, jets)
    roln_real sum[6] = {0, 0, 0, 0, 0, 0}, lost[6] = {0, 0, 0, 0, 0, 0}; /* of sum, as rest of mean */
    int w, i, j, pass;
    if (!rolni_batch_valid(b) || b->count < 1) return ROLN_E_LENGTH;
    rolni_zero(2 * dim, mean);
    for (pass = 0; pass < 2; pass++)
        for (w = 0; w < b->count; w++) {
            rolni_gather(b, b->q, N, w, 1, 0, 1 / m->scale->q, x);
            if (jets > 1) rolni_gather(b, b->qd, N, w, 1, 0, f, x + N);
            if (jets > 2) rolni_gather(b, b->qdd, N, w, 1, 0, f * m->scale->t, x + 2 * N);
            rolni_divide_each(jets, N, rolni_each(m->model, m), x);
            roln_ae_encode(ae, jets, 1, m->theta, x, z, tape);
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

/* The unit of inertia scale.m of a machine whose forces are known: 2^(10 k), about a thousand to the power k, such that
   rms tau_z / rms zdd over the windows of b (first samples), in m's other units, is 1/32 .. 32 of it. The networks begin with
   M = I, and logarithms of ten and more would be out of their reach. tau_z = J^T tau or, of a model with inputs, u itself: B is
   learned. b with qdd and tau. ROLN_E_LENGTH: no window, or without these; ROLN_E_NOT_FINITE, also for a machine that no force
   moves, or beyond 1e+-18. inertia is untouched unless ROLN_OK. Cost roln_encode of 3-jets and roln_reduce for each window.
   work [ROLN_FIT_INERTIA_WORK]. */
#define ROLN_FIT_INERTIA_MEM(X, S) \
    X(x, 3 * S(N)) X(z, 3 * S(n)) X(in, S(force_size)) X(tau_z, S(inputs) > 0 ? 0 : S(n))
#define ROLN_FIT_INERTIA_WORK(S) \
    (0 ROLN_FIT_INERTIA_MEM(ROLNI_SIZE, S) + ROLN_MAX(ROLN_AE_ENCODE_TAPE(S, 3, 1), S(inputs) > 0 ? 0 : ROLNI_TORQUE_WORK(S, 1)))
ROLN_INLINE roln_status roln_fit_inertia(const roln_trained *m, const roln_batch *b, roln_real *inertia, roln_real *work)
{
    const roln_model *md = m->model;
    const roln_ae *ae = &md->ae;
    const int N = ae->size[0], n = md->lnn.n, inputs = md->inputs, force_size = roln_force_size(md);
    const roln_real v = rolni_velocity_unit(m->scale), unit = rolni_force_unit(m->scale) * m->scale->m;
    double forced = 0, moved = 0;
    roln_real ratio, found = 1;
    int w;
    ROLN_FIT_INERTIA_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    rolni_driven d;
    if (!rolni_batch_valid(b) || b->count < 1 || !b->qd || !b->qdd || !b->tau) return ROLN_E_LENGTH;
    rolni_drive(m, in, &d, work);
    for (w = 0; w < b->count; w++) {
        rolni_gather(b, b->q, N, w, 1, 0, 1 / m->scale->q, x);
        rolni_gather(b, b->qd, N, w, 1, 0, v, x + N);
        rolni_gather(b, b->qdd, N, w, 1, 0, v * m->scale->t, x + 2 * N);
        rolni_divide_each(3, N, rolni_each(md, m), x);
        roln_ae_encode(ae, 3, 1, m->theta, x, z, work);
        if (!roln_all_finite(3 * n, z)) return ROLN_E_NOT_FINITE;
        rolni_gather(b, b->tau, force_size, w, 1, 0, unit, in);
        rolni_multiply_each(1, force_size, rolni_each_force(md, m), in);
        if (inputs == 0) rolni_torque_eval(&d.torque, 1, z, tau_z);
        forced += ROLNI_AS(double, inputs > 0 ? roln_dot(inputs, in, in) : roln_dot(n, tau_z, tau_z)) / b->count;
        moved += ROLNI_AS(double, roln_dot(n, z + 2 * n, z + 2 * n)) / b->count;
    }
    ratio = ROLN_SQRT(ROLNI_AS(roln_real, forced)) / ROLN_SQRT(ROLNI_AS(roln_real, moved));
    if (!(ratio > ROLN_C(1e-18)) || !(ratio < ROLN_C(1e18))) return ROLN_E_NOT_FINITE;
    for (; ratio > 32; ratio /= 1024)
        found *= 1024;
    for (; ratio < ROLN_C(0.03125); ratio *= 1024)
        found /= 1024;
    *inertia = found;
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

/* Low and high z, largest |zd| [n] over the first samples of the windows of b. Status of roln_encode; then they are scratch.
   work [ROLNI_RANGE_WORK]. */
#define ROLNI_RANGE_MEM(X, S) X(s, 2 * S(n))
#define ROLNI_RANGE_WORK(S) (0 ROLNI_RANGE_MEM(ROLNI_SIZE, S) + ROLN_ENCODE_WORK(S, 2))
ROLN_INLINE roln_status rolni_range(const roln_trained *m, const roln_batch *b, roln_real *low, roln_real *high, roln_real *top,
                                    roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    ROLNI_RANGE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    int w, i;
    for (w = 0; w < b->count; w++) {
        const size_t row = rolni_sample(b, w, 0) * ROLNI_AS(size_t, N);
        const roln_status st = roln_encode(m, b->q + row, b->qd + row, NULL, s, s + n, NULL, work);
        if (st != ROLN_OK) return st;
        for (i = 0; i < n; i++) {
            const roln_real v = ROLN_ABS(s[n + i]);
            low[i] = w == 0 || s[i] < low[i] ? s[i] : low[i];
            high[i] = w == 0 || s[i] > high[i] ? s[i] : high[i];
            top[i] = w == 0 || v > top[i] ? v : top[i];
        }
    }
    return ROLN_OK;
}

/* Range seen in training: z_min, z_max, zd_max [n] (largest |zd|) over the samples q, qd [count][N]; of an angle it is -pi .. pi.
   ROLN_E_LENGTH: count below 1; status of roln_encode. The outputs are written only on ROLN_OK. work [ROLN_FIT_RANGE_WORK]. */
#define ROLN_FIT_RANGE_MEM(X, S) X(low, S(n)) X(high, S(n)) X(top, S(n))
#define ROLN_FIT_RANGE_WORK(S) (0 ROLN_FIT_RANGE_MEM(ROLNI_SIZE, S) + ROLNI_RANGE_WORK(S))
ROLN_INLINE roln_status roln_fit_range(const roln_trained *m, int count, const roln_real *q, const roln_real *qd, roln_real *z_min,
                                       roln_real *z_max, roln_real *zd_max, roln_real *work)
{
    const int n = m->model->lnn.n;
    const roln_batch b = {count, 0, 1, NULL, q, qd, NULL, NULL};
    roln_status st;
    int i;
    ROLN_FIT_RANGE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    if (count < 1) return ROLN_E_LENGTH;
    if ((st = rolni_range(m, &b, low, high, top, work)) != ROLN_OK) return st;
    for (i = 0; i < n; i++)
        if (roln_lnn_angle(&m->model->lnn, i)) low[i] = -ROLNI_PI, high[i] = ROLNI_PI;
    rolni_copy(n, low, z_min);
    rolni_copy(n, high, z_max);
    rolni_copy(n, top, zd_max);
    return ROLN_OK;
}

/* What one sample of good motion asks of limits: range, distance from the manifold; x [2N]. ROLN_E_RANGE: it is outside of a range
   that has no width. */
ROLN_INLINE roln_status rolni_fit_seen(const roln_trained *m, const rolni_seen *seen, roln_limits *most)
{
    const roln_lnn *lnn = &m->model->lnn;
    const int N = m->model->ae.size[0], n = lnn->n;
    int i;
    for (i = 0; i < n; i++) {
        const roln_real wide = m->z_max[i] - m->z_min[i], z = seen->z[i];
        const roln_real out = roln_lnn_angle(lnn, i) ? 0 : ROLN_MAX(m->z_min[i] - z, z - m->z_max[i]);
        const roln_real fast = ROLN_ABS(seen->zd[i]) - m->zd_max[i];
        if ((out > 0 && !(wide > 0)) || (fast > 0 && !(m->zd_max[i] > 0))) return ROLN_E_RANGE;
        if (out > 0) most->margin = ROLN_MAX(most->margin, out / wide);
        if (fast > 0) most->margin = ROLN_MAX(most->margin, fast / m->zd_max[i]);
    }
    for (i = 0; i < N; i++) {
        const roln_real q = ROLN_ABS(seen->q[i] - roln_lnn_near(lnn, i, seen->q[i], seen->x[i]));
        const roln_real qd = ROLN_ABS(seen->qd[i] - seen->x[N + i]);
        most->q_off = ROLN_MAX(most->q_off, q), most->qd_off = ROLN_MAX(most->qd_off, qd);
    }
    return ROLN_OK;
}

/* Limits from recordings of good motion, the ticks of a controller: window w of b is a recording of b->steps + 1 samples l->dt
   seconds apart, b->stride = 1; b->tau [samples][roln_force_size] the torque from each sample on (NULL: none acted). l->dt, hold,
   window, strict and safe are yours and stay; margin, power, q_off, qd_off become slack times what these recordings need at least,
   margin no less than .1. With b->tau, tau_each and rate_each [roln_force_size] become slack times the largest torque of each
   joint and its largest change, l points to them, and l->tau, l->rate are the largest of all; without, they stay, and where
   l->motors says that the torques of limits are others than those of b.
   A need of 0 makes a limit of 0, and power, q_off, qd_off are not checked then.
   ROLN_E_LENGTH: less than two samples, or stride is not 1. ROLN_E_RANGE: slack is not 1 or more, dt not positive, window negative,
   l->tau 0 where it has to be yours, a joint's torque that is not 0 and never changes, of which there would be no limit of rate, or
   the model holds no range (NAME_fit_range). ROLN_E_NOT_FINITE, status of roln_encode. Then nothing is written.
   work [ROLN_FIT_LIMITS_WORK]. */
#define ROLN_FIT_LIMITS_MEM(X, S) \
    X(x, 2 * S(N)) X(z, S(n)) X(zd, S(n)) X(held, S(force_size)) X(top, S(force_size)) X(rise, S(force_size))
#define ROLN_FIT_LIMITS_WORK(S) \
    (0 ROLN_FIT_LIMITS_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(S(guard_work), ROLN_MAX(ROLN_ENCODE_WORK(S, 2), ROLN_DECODE_WORK(S))))
ROLN_INLINE roln_status roln_fit_limits(const roln_trained *m, const roln_batch *b, roln_real slack, roln_limits *l,
                                        roln_real *tau_each, roln_real *rate_each, roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, force_size = roln_force_size(m->model);
    const roln_real none = ROLN_C(1e30);
    roln_limits open = {l->dt, none, none, none, 0, 0, 0, l->window, 0, 0, NULL, NULL, NULL, NULL}, most = *l;
    ROLN_FIT_LIMITS_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    const int torques = b->tau && (!l->motors || !l->motors->B);
    int w, h, i;
    if (b->count < 1 || b->steps < 1 || b->stride != 1 || !b->qd) return ROLN_E_LENGTH;
    if (!(slack >= 1) || !rolni_limits_valid(&open, 0) || (!torques && !l->tau_each && !(l->tau > 0))) return ROLN_E_RANGE;
    most.margin = most.power = most.q_off = most.qd_off = 0;
    rolni_zero(2 * force_size, top); /* and rise */
    for (w = 0; w < b->count; w++) {
        roln_guard g = {0, 0, 0, 0, 0, 0, 0};
        rolni_zero(force_size, held);
        for (h = 0; h <= b->steps; h++) {
            const size_t at = rolni_sample(b, w, h), each = ROLNI_AS(size_t, force_size);
            const roln_real *q = b->q + at * ROLNI_AS(size_t, N), *qd = b->qd + at * ROLNI_AS(size_t, N);
            const roln_real *tau = b->tau ? b->tau + at * each : NULL;
            const roln_measured measured = {q, qd};
            const roln_held to = {&g, held};
            const rolni_seen seen = {q, qd, z, zd, x, NULL};
            roln_status st = roln_encode(m, q, qd, NULL, z, zd, NULL, work);
            if (st == ROLN_OK) st = roln_decode(m, z, zd, x, x + N, work);
            if (st == ROLN_OK) st = rolni_fit_seen(m, &seen, &most);
            if (st != ROLN_OK) return st;
            for (i = 0; i < force_size && tau; i++) {
                top[i] = ROLN_MAX(top[i], ROLN_ABS(tau[i]));
                if (h > 0) rise[i] = ROLN_MAX(rise[i], ROLN_ABS(tau[i] - held[i]) / l->dt);
            }
            if (roln_guard_tick(m, &open, &measured, z, zd, tau ? tau : held, &to, work)) return ROLN_E_NOT_FINITE;
            most.power = ROLN_MAX(most.power, ROLN_ABS(g.residual));
        }
    }
    most.margin = ROLN_MAX(slack * most.margin, ROLN_C(0.1));
    most.power *= slack, most.q_off *= slack, most.qd_off *= slack;
    if (torques) most.tau = most.rate = 0, most.tau_each = tau_each, most.rate_each = rate_each;
    for (i = 0; i < force_size && torques; i++) {
        if (top[i] > 0 && !(rise[i] > 0)) return ROLN_E_RANGE;
        rise[i] += 4 * ROLN_EPS * top[i] / l->dt; /* what rounds when torques are clipped */
        top[i] *= slack, rise[i] *= slack;
        most.tau = ROLN_MAX(most.tau, top[i]), most.rate = ROLN_MAX(most.rate, rise[i]);
    }
    {
        const roln_real made[6] = {most.margin, most.power, most.q_off, most.qd_off, most.tau, most.rate};
        if (!roln_all_finite(torques ? 6 : 4, made)) return ROLN_E_NOT_FINITE;
    }
    if (torques) rolni_copy(force_size, top, tau_each), rolni_copy(force_size, rise, rate_each);
    *l = most;
    return ROLN_OK;
}

/* Log likelihood of the recordings in b under noise, to *sum; NaN in q: not measured. work: f. */
ROLN_INLINE roln_status rolni_noise_likelihood(const roln_trained *m, const roln_noise *noise, const roln_batch *b,
                                               const rolni_filter *f, double *sum)
{
    const int N = m->model->ae.size[0], n2 = 2 * m->model->lnn.n, force_size = roln_force_size(m->model);
    rolni_innovation in;
    int w, h, i;
    *sum = 0;
    for (w = 0; w < b->count; w++)
        for (h = 0; h <= b->steps; h++) {
            const size_t at = rolni_sample(b, w, h);
            const roln_real *const y = b->q + at * ROLNI_AS(size_t, N);
            if (h == 0) {
                if (rolni_filter_start(m, noise, y, NULL, f, &in) != ROLN_FILTER_START) return ROLN_E_NOT_FINITE;
            } else {
                const roln_real *const tau = b->tau ? b->tau + (at - 1) * ROLNI_AS(size_t, force_size) : NULL;
                roln_status st = rolni_filter_predict(m, noise, tau, f);
                if (st == ROLN_OK) st = rolni_filter_correct(m, noise, 0, y, f, &in);
                if (st != ROLN_OK) return st;
            }
            if (in.used == 0) continue;
            *sum -= ROLNI_AS(double, in.nis) / 2;
            for (i = 0; i < n2; i++)
                *sum -= ROLNI_AS(double, roln_log(ROLN_ABS(f->A[i * (n2 + 1)])));
        }
    return ROLN_OK;
}

/* Deviation of the noise of each joint, q_each [N], from fourth differences of the positions, which motion that is slow beside dt
   hardly has: their variance is 70 times that of white noise. */
ROLN_FN void rolni_noise_of_joints(const roln_trained *m, const roln_batch *b, roln_real *q_each)
{
    static const roln_real part[5] = {1, -4, 6, -4, 1};
    const int N = m->model->ae.size[0];
    int w, h, i, k;
    for (i = 0; i < N; i++) {
        double sum = 0, count = 0;
        for (w = 0; w < b->count; w++)
            for (h = 2; h <= b->steps - 2; h++) {
                const roln_real *const y = b->q + rolni_sample(b, w, h) * ROLNI_AS(size_t, N) + i;
                roln_real d = 0;
                for (k = -2; k <= 2; k++)
                    d += part[k + 2] * (roln_lnn_near(&m->model->lnn, i, *y, y[k * N]) - *y);
                if (!roln_finite(d)) continue;
                count += 1;
                sum += ROLNI_AS(double, d) * ROLNI_AS(double, d) / 70;
            }
        q_each[i] = ROLN_SQRT(ROLNI_AS(roln_real, sum / count));
    }
}

/* Adds to q_each [N] what the chart leaves of each joint: q_each^2 += mean of r_k r_k+1, r = q - phi(rho(q)), over neighbours k and
   k + 1. White noise is in r, too, but drops out of this mean, which is that of r^2 if motion is slow beside dt. Samples that are
   not complete do not count. left [3N] and the arrays of f: scratch. */
ROLN_INLINE void rolni_noise_of_chart(const roln_trained *m, const roln_batch *b, const rolni_filter *f, roln_real *left,
                                      roln_real *q_each)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n;
    roln_real *const rest = left + N, *const before = rest + N, *const x = f->rows, *const still = f->J;
    double count = 0;
    int w, h, i;
    rolni_zero(2 * N, left);
    rolni_zero(N, still);
    for (w = 0; w < b->count; w++) {
        int known = 0;
        for (h = 0; h <= b->steps; h++) {
            const roln_real *const y = b->q + rolni_sample(b, w, h) * ROLNI_AS(size_t, N);
            const int last = known;
            known = roln_encode(m, y, still, NULL, f->s, f->s + n, NULL, f->work) == ROLN_OK;
            if (known) known = rolni_decode(m, f->s, f->s + n, x, f->work, f->A) == ROLN_OK;
            for (i = 0; i < N && known; i++) {
                const roln_real r = y[i] - roln_lnn_near(&m->model->lnn, i, y[i], x[i]);
                if (last) rest[i] += r * before[i];
                before[i] = r;
            }
            if (!known || !last) continue;
            rolni_fold(N, left, rest);
            count += 1;
        }
    }
    for (i = 0; i < N; i++)
        if (left[i] > 0) q_each[i] = ROLN_SQRT(q_each[i] * q_each[i] + left[i] / ROLNI_AS(roln_real, count));
}

/* Noise of roln_filter_tick from recordings: window w of b is one of b->steps + 1 ticks l->dt seconds apart, b->stride = 1, of
   positions b->q as the encoders give them, not smoothed, and of the torques b->tau, NULL: none acted; b->qd is not read. The first
   sample is complete, later ones may be NaN. l->dt, gate, lost are yours and stay. l->q above 0, or l->q_each, stay, and have to
   count for both, the noise of a joint and what the chart leaves of it; with l->q = 0 q_each [N] becomes the root of the sum of
   their squares, noise^2 + mean (q - phi(rho(q)))^2 (at least 5 ticks), and l->q_each points to it (held by test_filter.c:
   test_fit_chart). l->tau becomes four times the largest
   under which what was measured is as likely as under any, to a factor of e^2, of halves of the torque that gives the largest
   velocity of training in one tick (four times: the error of a model lasts, white noise does not, and F^T F is to hold it);
   l->tau_each NULL. l->load is yours, too; nothing but the machine that was trained moved.
   ROLN_E_LENGTH: no window, less than 2 ticks, or stride is not 1; ROLN_E_RANGE: l makes no sense, a joint has no noise, q_each
   is NULL where it is needed, or the model holds no range; ROLN_E_NOT_FINITE, status of roln_linear. l and q_each stay as they were
   unless ROLN_OK. Cost: 8 to 60 times roln_filter_tick for every tick. work [ROLN_FIT_NOISE_WORK]. */
#define ROLNI_HALVINGS 60
#define ROLN_FIT_NOISE_MEM(X, S) X(each, S(N)) X(left, 3 * S(N))
#define ROLN_FIT_NOISE_WORK(S) (0 ROLN_FIT_NOISE_MEM(ROLNI_SIZE, S) + S(noise_work))
ROLN_INLINE roln_status roln_fit_noise(const roln_trained *m, const roln_batch *b, roln_noise *l, roln_real *q_each,
                                       roln_real *work)
{
    const int N = m->model->ae.size[0], n = m->model->lnn.n, estimate = l->q >= 0 && l->q <= 0 && !l->q_each;
    ROLN_FIT_NOISE_MEM(ROLNI_CARVE, ROLNI_LOCAL)
    roln_noise noise = *l;
    rolni_innovation in;
    rolni_filter f;
    const double none = -1e300;
    double sum[ROLNI_HALVINGS];
    roln_real top = 0;
    roln_status st = ROLN_OK;
    int i, k, best = 0, worse = 0;
    if (b->count < 1 || b->stride != 1 || b->steps < (estimate ? 4 : 1)) return ROLN_E_LENGTH;
    rolni_filter_lay(N, n, 0, &f, work);
    noise.tau = 1, noise.tau_each = NULL;
    if (estimate && !q_each) return ROLN_E_RANGE;
    if (estimate) rolni_noise_of_joints(m, b, each), rolni_noise_of_chart(m, b, &f, left, each), noise.q_each = each;
    if (!rolni_noise_valid(N, &noise)) return ROLN_E_RANGE;
    switch (rolni_filter_start(m, &noise, b->q + rolni_sample(b, 0, 0) * ROLNI_AS(size_t, N), NULL, &f, &in)) {
    case ROLN_FILTER_START: st = rolni_filter_unknown(m, &noise, &f, f.rows); break;
    case ROLN_FAULT_RANGE | ROLN_FILTER_NONE: return ROLN_E_RANGE;
    default: return ROLN_E_NOT_FINITE;
    }
    if (st != ROLN_OK) return st; /* unreached: the start has evaluated the model there */
    for (i = 0; i < n; i++) { /* |row i of M^-1 J^T| dt */
        roln_real square = 0;
        for (k = 0; k < n; k++)
            square += f.rows[k * 2 * n + n + i] * f.rows[k * 2 * n + n + i];
        top = ROLN_MAX(top, m->zd_max[i] / ROLN_SQRT(square));
    }
    for (k = 0, noise.tau = top; k < ROLNI_HALVINGS && worse < 6; k++, noise.tau /= 2) {
        const roln_status got = rolni_noise_likelihood(m, &noise, b, &f, sum + k);
        if (got != ROLN_OK) st = got, sum[k] = none;
        else if (sum[k] > sum[best]) best = k, worse = 0;
        else worse++;
    }
    if (!(sum[best] > none)) return st;
    for (k = 0; sum[k] < sum[best] - 2; k++)
        top /= 2;
    /* unreached: q_each is there, or this had ended above */
    if (estimate && q_each) rolni_copy(N, each, q_each), l->q_each = q_each;
    l->tau = 4 * top, l->tau_each = NULL;
    return ROLN_OK;
}

/* The encoder of a chart. Coordinates z of the same space of columns of Psi have the same polynomials, whatever their scale and
   origin: what the best decoder leaves of the samples is a function of that space. Its logarithm is made small by Riemannian L-BFGS
   over Psi with orthonormal columns, each value a fit in closed form. What is kept between steps, to be zeroed before the first,
   and scratch in double: */
#define ROLN_TURN_PAIRS 20
typedef struct {
    roln_lbfgs *state;
    roln_real *psi;      /* [n][N_{L-1}] orthonormal rows */
    roln_real *from;     /* [N_{L-1}] z is measured from here: b of the start */
    roln_real *keep;     /* [ROLN_LBFGS_KEEP(ROLN_TURN_PAIRS, n N_{L-1})] */
    double *sums, *room; /* [ROLN_CHART_SUMS], [ROLN_CHART_TURN_ROOM] */
} roln_turn;
#define ROLN_CHART_TURN_ROOM(S) ROLN_MAX(ROLN_CHART_ADD_ROOM(S), ROLN_CHART_SOLVE_ROOM(S))

/* The fit for one encoder. */
#define ROLNI_ENCODER_MEM(X, S) \
    X(low, S(n)) X(high, S(n)) X(top, S(n)) X(x, ROLN_CHART_BLOCK * S(N)) X(cov, 2 * S(n) * S(n)) \
    X(dual, S(n) * S(n)) X(modes, S(n) * S(n)) X(gm, S(n) * S(bent)) X(rest, S(n) * S(bent))
#define ROLNI_ENCODER_WORK(S) \
    (0 ROLNI_ENCODER_MEM(ROLNI_SIZE, S) + \
     ROLN_MAX(ROLN_MAX(ROLNI_RANGE_WORK(S), ROLN_SPD_FRAME_WORK(S(n))), \
              ROLN_MAX(ROLN_CHART_ADD_WORK(S), ROLN_CHART_GRAD_WORK(S, ROLN_CHART_BLOCK))))
typedef struct {
    const roln_trained *m;
    const roln_batch *batch;
    const roln_turn *turn;
    roln_real *theta; /* of m */
    ROLNI_ENCODER_MEM(ROLNI_FIELD, ROLNI_LOCAL)
    roln_real *work;
    roln_real residual; /* of the last fit */
    roln_status status;
} rolni_encoder;

/* Samples at .. of the batch, a block of them, scaled, to f->x; returns how many. */
ROLN_FN int rolni_encoder_block(const rolni_encoder *f, int at)
{
    const int left = f->batch->count - at, now = ROLN_MIN(left, ROLN_CHART_BLOCK);
    const roln_model *md = f->m->model;
    rolni_gather(f->batch, f->batch->q, md->ae.size[0], at, now, 0, 1 / f->m->scale->q, f->x);
    rolni_divide_each(now, md->ae.size[0], rolni_each(md, f->m), f->x);
    return now;
}

/* cov(z) and the mean of zd zd^T, [2][n][n], to f->cov; f->turn->sums is scratch. */
ROLN_FN roln_status rolni_encoder_spread(rolni_encoder *f)
{
    const int N = f->m->model->ae.size[0], n = f->m->model->lnn.n;
    const double count = f->batch->count;
    double *const mean = f->turn->sums, *const square = mean + n;
    roln_real *const z = f->x, *const zd = z + n; /* room for ROLN_CHART_BLOCK inputs, of which each is longer than n */
    int w, i, j;
    for (i = 0; i < n + 2 * n * n; i++)
        mean[i] = 0;
    for (w = 0; w < f->batch->count; w++) {
        const size_t row = rolni_sample(f->batch, w, 0) * ROLNI_AS(size_t, N);
        const roln_status st = roln_encode(f->m, f->batch->q + row, f->batch->qd + row, NULL, z, zd, NULL, f->work);
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
        f->cov[i] = ROLNI_AS(roln_real, square[i]);
    return ROLN_OK;
}

/* Psi and Phi become modes of motion of the samples, slow ones first: coordinates in which neither positions nor velocities are
   correlated, as in normal modes, where M and the stiffness are diagonal. dual and modes are V and W of the frame of cov(zd) at
   cov(z) (roln_spd_frame). ROLN_E_ILL_CONDITIONED: to working precision the samples lie in fewer than n dimensions. */
ROLN_FN roln_status rolni_encoder_modes(rolni_encoder *f, const roln_real *psi, roln_real *layer)
{
    const int n = f->m->model->lnn.n, bent = roln_ae_bent(&f->m->model->ae);
    roln_real *const A = f->cov, *const X = A + n * n;
    roln_status st = rolni_encoder_spread(f);
    if (st != ROLN_OK) return st;
    if (!roln_all_finite(2 * n * n, A)) return ROLN_E_NOT_FINITE;
    if (roln_chol(n, A, A) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
    /* unreached: of a positive A it fails if eigenvalues overflow */
    if ((st = roln_spd_frame(n, A, X, f->low, f->dual, f->modes, f->work)) != ROLN_OK) return st;
    roln_mm(n, n, bent, f->dual, psi, layer);
    roln_mm(n, n, bent, f->modes, psi, layer + n * bent);
    return ROLN_OK;
}

/* Modes of the space of psi in which the samples lie in [-1, 1], and the best decoder for them. low, high, top: least and largest
   z, largest |zd|, before they are stretched. */
ROLN_FN roln_status rolni_encoder_fit(rolni_encoder *f, const roln_real *psi)
{
    const roln_ae *ae = &f->m->model->ae;
    const int n = ae->size[ae->layers], bent = roln_ae_bent(ae), m = 1 + n + ae->curves;
    roln_real *layer = f->theta + rolni_bent_at(ae);
    double *const sums = f->turn->sums;
    roln_status st;
    int w, now, i;
    rolni_copy(n * bent, psi, layer + n * bent);
    rolni_copy(bent, f->turn->from, layer + 2 * n * bent);
    if ((st = rolni_encoder_modes(f, psi, layer)) != ROLN_OK) return st;
    /* unreached: the samples have been encoded above */
    if ((st = rolni_range(f->m, f->batch, f->low, f->high, f->top, f->work)) != ROLN_OK) return st;
    if ((st = roln_chart_center(ae, f->low, f->high, f->theta)) != ROLN_OK) return st;
    for (i = 0; i <= m * (m + 1) / 2 + m * bent; i++)
        sums[i] = 0;
    for (w = 0; w < f->batch->count; w += now) {
        now = rolni_encoder_block(f, w);
        st = roln_chart_add(ae, f->theta, now, f->x, 1, NULL, sums, f->turn->room, f->work);
        if (st != ROLN_OK) return st; /* unreached: the samples have been encoded above */
    }
    return roln_chart_solve(ae, sums, ROLN_CHART_RIDGE, f->theta, &f->residual, f->turn->room);
}

/* log of the residual, sqrt((sum |v - C^T f|^2 + ridge count |W|^2) / sum |v - mean|^2), for roln_lbfgs_step; below ROLN_EPS it
   counts as nothing. g leaves out what the coordinates of Psi do to |W|, a little of what is itself little. */
ROLN_FN roln_real rolni_encoder_value(void *ctx, const roln_real *psi, roln_real *g)
{
    rolni_encoder *f = ROLNI_AS(rolni_encoder *, ctx);
    const roln_ae *ae = &f->m->model->ae;
    const int n = ae->size[ae->layers], bent = roln_ae_bent(ae), m = 1 + n + ae->curves;
    const roln_real *W = f->theta + rolni_ae_layers(ae);
    const double *sums = f->turn->sums;
    double sum = 0, W2 = 0, both;
    int w, now, i, j;
    f->status = rolni_encoder_fit(f, psi);
    if (f->status != ROLN_OK) return rolni_real(ROLNI_INF);
    rolni_zero(2 * n * bent, f->gm); /* and rest */
    for (w = 0; w < f->batch->count; w += now) {
        now = rolni_encoder_block(f, w);
        roln_chart_grad(ae, f->theta, now, f->x, 1, &sum, f->rest, f->work);
        if ((w + now) % (128 * ROLNI_PARTS) == 0) rolni_fold(n * bent, f->gm, f->rest);
    }
    rolni_fold(n * bent, f->gm, f->rest);
    for (i = 0; i < ae->curves * bent; i++)
        W2 += ROLNI_AS(double, W[i]) * ROLNI_AS(double, W[i]);
    both = sum + ROLNI_AS(double, ROLN_CHART_RIDGE) * sums[0] * W2;
    f->residual = ROLN_SQRT(ROLNI_AS(roln_real, both / rolni_chart_spread(m, bent, sums)));
    for (i = 0; i < n; i++) { /* of psi, from that of modes psi, stretched */
        /* unreached: a residual of exactly 0 */
        const roln_real half = f->high[i] / 2 - f->low[i] / 2, unit = both > 0 ? ROLNI_AS(roln_real, 2 * both) * half : 1;
        for (j = 0; j < n; j++)
            f->modes[i * n + j] /= unit;
    }
    roln_mm_at(n, n, bent, f->modes, f->gm, g);
    return roln_log(ROLN_MAX(f->residual, ROLN_EPS));
}

/* One step for the encoder of the bent layer, on the first samples of the windows of the batch, the same ones in every step. theta:
   that of m, in and out. It comes out as a model with the encoder that the step led to, in coordinates that are modes of the
   samples' motion, slow ones first, z uncorrelated and zd, too, in which the samples lie in [-1, 1], and with Phi, b and W fitted
   to them, with ROLN_CHART_RIDGE. zd_max [n] out: the largest |zd|; for both the batch has qd. residual [1] out: what is left as in
   roln_chart_solve, but with the ridge; no step raises it.
   The first step begins with the encoder in theta. A few thousand samples that show all of the motion suffice, and it is done when
   the residual falls by less than a hundredth in 20 steps; roln_chart_add and roln_chart_solve then fit the decoder to all samples.
   theta and the outputs are untouched unless ROLN_OK. ROLN_E_NO_CONVERGENCE: no step lowers the residual, which is the end; the
   first call then fits the start, with ROLN_OK. ROLN_E_LENGTH: no sample or no qd; ROLN_E_ILL_CONDITIONED: columns of Psi are
   dependent, or to working precision the samples lie in fewer than n dimensions; ROLN_E_SHAPE: no layer is bent, or not ROLN_FULL;
   else as roln_encode, roln_chart_center, roln_chart_add, roln_chart_solve. work [ROLN_CHART_TURN_WORK].
   Cost: one fit, now and then several, 40 at most; a fit is ROLN_CHART_SUMS multiply-adds in double and 5 F N_{L-1} more for each
   sample, and a solve. */
#define ROLN_CHART_TURN_MEM(X, S, step_size) X(kept, (2 * S(n) + 1 + S(curves)) * S(bent)) X(step, step_size)
#define ROLNI_TURN_STEP(S) ROLN_LBFGS_WORK(ROLN_TURN_PAIRS, S(n) * S(bent), ROLN_STIEFEL_BLOCK_WORK(S(n), S(bent)))
#define ROLN_CHART_TURN_WORK(S) (0 ROLN_CHART_TURN_MEM(ROLNI_SIZE, S, ROLNI_TURN_STEP(S)) + ROLNI_ENCODER_WORK(S))
ROLN_INLINE roln_status roln_chart_turn(const roln_trained *m, const roln_batch *batch, const roln_turn *t, roln_real *theta,
                                        roln_real *zd_max, roln_real *residual, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const int N = ae->size[0], n = m->model->lnn.n, bent = roln_ae_bent(ae), curves = ae->curves;
    const roln_block encoder = {&roln_stiefel, n, bent, 0};
    const roln_lbfgs start = ROLN_LBFGS_START;
    rolni_encoder fit, *b = &fit;
    roln_status st = rolni_grad_valid(m, batch, 1);
    roln_real *layer, *row;
    int i, j;
    ROLN_CHART_TURN_MEM(ROLNI_CARVE, ROLNI_LOCAL, ROLNI_TURN_STEP(ROLNI_LOCAL))
    ROLNI_ENCODER_MEM(ROLNI_LAY, ROLNI_LOCAL)
    b->m = m, b->batch = batch, b->turn = t, b->theta = theta, b->work = work, b->residual = 0, b->status = ROLN_OK;
    if (st != ROLN_OK) return st;
    if (curves == 0) return ROLN_E_SHAPE;
    if (batch->count < 1 || !batch->qd) return ROLN_E_LENGTH;
    layer = theta + rolni_bent_at(ae);
    if (t->state->t == 0) {
        *t->state = start;
        rolni_copy(bent, layer + 2 * n * bent, t->from);
        rolni_copy(n * bent, layer + n * bent, t->psi);
        for (row = t->psi, i = 0; i < n; i++, row += bent) {
            const roln_real size = ROLN_SQRT(roln_dot(bent, row, row));
            for (j = 0; j < bent; j++)
                row[j] /= size;
        }
        if ((st = rolni_orthonormal(n, bent, t->psi, step)) != ROLN_OK) return st;
    }
    rolni_copy((2 * n + 1 + curves) * bent, layer, kept);
    st = roln_lbfgs_step(1, &encoder, ROLN_TURN_PAIRS, rolni_encoder_value, b, t->state, t->psi, t->keep, step);
    if (st == ROLN_E_NO_CONVERGENCE && t->state->t == 0) { /* the start is the best encoder: fitted, it is the first step */
        t->state->t = 1;
        st = rolni_encoder_fit(b, t->psi);
    }
    if (st != ROLN_OK) {
        rolni_copy((2 * n + 1 + curves) * bent, kept, layer);
        /* unreached: a value that is not finite has a status */
        return st == ROLN_E_NOT_FINITE && b->status != ROLN_OK ? b->status : st;
    }
    for (i = 0; i < n; i++) /* the last fit was that of the step */
        zd_max[i] = b->top[i] / (b->high[i] / 2 - b->low[i] / 2);
    *residual = b->residual;
    return ROLN_OK;
}

/* Sums over windows at one horizon: E_q = sqrt(q / q_var), E_qd = sqrt(qd / qd_var), of one joint or of all; of all in units of q
   where joints have the same unit, else in parts of their own. Double, for windows may be many. */
typedef struct {
    double q, q_var;   /* |q_pred - q|^2, |q - qbar|^2 */
    double qd, qd_var; /* |qd_pred - qd|^2, |qd|^2 */
} roln_error;

/* Where errors go, for each horizon: those of all joints together, and those of each joint, [N], in its own unit; NULL: not
   wanted. */
typedef struct {
    roln_error *all, *joints;
} roln_errors_to;

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

/* Decodes nb states s and adds their errors against the data x [2][nb][N], scaled, to those of one horizon. */
#define ROLNI_ERRORS_DECODE_MEM(X, S, nb) X(Y, 2 * (nb) * S(N)) X(tape, ROLN_AE_DECODE_TAPE(S, 2, nb))
ROLN_INLINE void rolni_errors_decode(const roln_model *md, const roln_trained *m, int nb, const roln_real *s, const roln_real *x,
                                     const roln_real *qbar, roln_errors_to to, roln_real *work)
{
    const roln_ae *ae = &m->model->ae;
    const roln_lnn *lnn = &md->lnn;
    const int N = ae->size[0], ae_sum = roln_ae_sum(ae), curves = ae->curves;
    const roln_real q = m->scale->q, u = q / m->scale->t, *const each = rolni_each(md, m);
    roln_error *const e = to.all;
    ROLNI_ERRORS_DECODE_MEM(ROLNI_CARVE, ROLNI_LOCAL, nb)
    int i;
    roln_ae_decode(ae, 2, nb, m->theta, s, Y, tape);
    for (i = 0; i < nb * N; i++) {
        const roln_real d = q * (Y[i] - roln_lnn_near(lnn, i % N, Y[i], x[i])), at = q * x[i];
        const roln_real unit = each ? each[i % N] : 1, mid = each ? qbar[i % N] / unit : qbar[i % N];
        const roln_real c = at - roln_lnn_near(lnn, i % N, at, mid), v = u * x[nb * N + i], dv = u * Y[nb * N + i] - v;
        rolni_error_add(d, c, dv, v, e);
        if (to.joints) rolni_error_add(d * unit, c * unit, dv * unit, v * unit, to.joints + i % N);
    }
}

/* Roll-out errors: encode the first sample of every window, step to its end, compare at steps 0 (reconstruction), every,
   2 every ..: to->all [steps/every + 1], to->joints [steps/every + 1][N] out. Windows of any length, nb at a time; qbar [N] mean of
   the training q. A status other than ROLN_OK: bad data, or a roll-out left the domain; they are then partial. Status of
   roln_lnn_step, ROLN_E_NOT_FINITE; ROLN_E_LENGTH: no qd, every below 1, or a count as in roln_grad; they are then untouched.
   work [ROLN_ERRORS_WORK]. */
#define ROLN_ERRORS_MEM(X, S, nb, size) X(s, 2 * (nb) * S(n)) X(x, 2 * (nb) * S(N)) X(held, (nb) * (size))
#define ROLN_ERRORS_WORK(S, nb) \
    (0 ROLN_ERRORS_MEM(ROLNI_SIZE, S, nb, S(force_size)) + \
     ROLN_MAX(ROLN_AE_ENCODE_TAPE(S, 2, nb), \
              ROLN_MAX(0 ROLNI_ERRORS_DECODE_MEM(ROLNI_SIZE, S, nb), \
                       ROLNI_FORCE_WORK(S, nb, 0) + S(step_once))))
ROLN_INLINE roln_status roln_errors(const roln_trained *m, const roln_batch *b, roln_real dt, int nb, int every,
                                    const roln_real *qbar, const roln_errors_to *to, roln_real *work)
{
    const roln_model *md = m->model;
    const roln_scale *sc = m->scale;
    const int N = md->ae.size[0], n = md->lnn.n, size = roln_force_size(md);
    const roln_real *each = rolni_each(md, m), *each_force = rolni_each_force(md, m);
    roln_error *const e = to->all;
    roln_real *const start = work;
    size_t rows;
    int w, now, k;
    if (!b->qd || every < 1 || nb < 1 || !rolni_batch_valid(b)) return ROLN_E_LENGTH;
    rows = ROLNI_AS(size_t, b->steps / every) + 1;
    memset(e, 0, rows * sizeof *e);
    if (to->joints) memset(to->joints, 0, rows * ROLNI_AS(size_t, N) * sizeof *e);
    for (w = 0; w < b->count; w += now) {
        now = b->count - w < nb ? b->count - w : nb;
        ROLN_ERRORS_MEM(ROLNI_CARVE, ROLNI_LOCAL, now, size)
        roln_real *tape = work + rolni_torque_work(md, now, 0), *rest = tape + roln_lnn_tape(&md->lnn, 1, 0, now);
        roln_errors_to here;
        rolni_driven d;
        roln_status st;
        rolni_drive(m, b->tau ? held : NULL, &d, work);
        for (k = 0; k <= b->steps; k++) {
            if (k > 0) {
                if (b->tau) rolni_gather_tau(b, size, w, now, k - 1, rolni_force_unit(sc), held);
                if (b->tau) rolni_multiply_each(now, size, each_force, held);
                if ((st = roln_lnn_step(&md->lnn, &d.sys, md->scheme, 0, now, dt / sc->t, s, s, tape, rest)) != ROLN_OK) return st;
                rolni_turn_back(&md->lnn, now, s);
            }
            if (k % every != 0) continue;
            rolni_gather(b, b->q, N, w, now, k, 1 / sc->q, x);
            rolni_gather(b, b->qd, N, w, now, k, rolni_velocity_unit(sc), x + now * N);
            rolni_divide_each(2 * now, N, each, x);
            rolni_turn_back(&md->lnn, now, x);
            if (k == 0) roln_ae_encode(&md->ae, 2, now, m->theta, x, s, work);
            here.all = e + k / every;
            here.joints = to->joints ? to->joints + ROLNI_AS(size_t, k / every) * ROLNI_AS(size_t, N) : NULL;
            rolni_errors_decode(md, m, now, s, x, qbar, here, work);
        }
        work = start;
    }
    if (!rolni_errors_finite(rows, e)) return ROLN_E_NOT_FINITE;
    return to->joints && !rolni_errors_finite(rows * ROLNI_AS(size_t, N), to->joints) ? ROLN_E_NOT_FINITE : ROLN_OK;
}

/* Put index[0 .. count-1] in random order (Fisher-Yates): the same order for the same seed everywhere. */
ROLN_FN void roln_shuffle(int count, int *index, uint64_t *seed)
{
    int i;
    for (i = count - 1; i > 0; i--) {
        const int j = roln_randint(i + 1, seed), t = index[i];
        index[i] = index[j];
        index[j] = t;
    }
}

/* ---- 9 packed parameters ---------------------------------------------------------------------- */

/* Layout, little-endian: "ROLN", u16 format, u8 bytes per number, u8 number of sizes; the sizes, u16 each (rolni_pack_head);
   the numbers of NAME_params in their order: slope, least, scale.q, scale.t, scale.m, each [N] of a model with own units, dt,
   z_min [n], z_max [n], zd_max [n], theta, of which weights stored small are words; u64 FNV-1a of all before. The bits of angles,
   if there are any, are the last two sizes. In the macros each is the number of own units, N or 0.
   The functions of this section take the numbers of NAME_params through a pointer to the whole and copy them as bytes. */
#define ROLN_FORMAT 3
#define ROLN_NUMBERS(each, n, params) (6 + (each) + 3 * (n) + (params)) /* of NAME_params */
#define ROLN_PACKED(ae_layers, mlp_layers, layers, angles, each, n, params) \
    (8 + 2 * (8 + (ae_layers) + (mlp_layers) + 2 * (layers) + 2 * ((angles) > 0)) + \
     ROLNI_AS(int, sizeof(roln_real)) * ROLN_NUMBERS(each, n, params) + 8)

/* FNV-1a (64 bit) of count bytes, carried on from h; start with ROLN_FNV. */
#define ROLN_FNV UINT64_C(0xcbf29ce484222325)
ROLN_FN uint64_t roln_fnv(int count, const unsigned char *bytes, uint64_t h)
{
    int i;
    for (i = 0; i < count; i++)
        h = (h ^ bytes[i]) * UINT64_C(0x100000001b3);
    return h;
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
    uint32_t reference; /* CRC-32 of the parameters as they should be: of the first pass, or yours, with known = 1 */
    uint32_t sum;       /* of this pass so far */
    int known;          /* 1: reference is known */
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
    if (!c->known) c->reference = c->sum, c->known = 1;
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

/* The leading bytes: what must agree before the numbers mean anything. Returns their count. */
#define ROLNI_HEAD (8 + 2 * (8 + ROLN_AE_MAX + ROLN_MLP_MAX + 2 * ROLN_LAYERS_MAX + 2))
ROLN_FN int rolni_pack_head(const roln_model *md, unsigned char *bytes)
{
    const roln_lnn *f = &md->lnn;
    unsigned char *p = bytes;
    int flags, l;
    memcpy(p, "ROLN", 4);
    p += 4;
    rolni_put(&p, ROLN_FORMAT, 2);
    rolni_put(&p, sizeof(roln_real), 1);
    rolni_put(&p, ROLNI_AS(uint64_t, (8 + md->ae.layers + f->mass_net.layers + 2 * f->layers + 2 * (f->angles > 0))), 1);
    rolni_put(&p, ROLNI_AS(uint64_t, md->scheme), 2);
    rolni_put(&p, ROLNI_AS(uint64_t, md->inputs), 2);
    flags = f->mass + 2 * f->base + 4 * f->damping + 8 * rolni_ae_bits(&md->ae) + 256 * md->ae.degree;
    flags += 4096 * f->friction + 8192 * md->own;
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
   ROLN_E_PRECISION, ROLN_E_SHAPE (sizes, storage, chart, mass matrix, scheme, angles, units, slope or least differ; scale.q or each
   of angles is not 1), ROLN_E_CHECKSUM, ROLN_E_NOT_FINITE (a number is not, or a scale is not positive), ROLN_E_RANGE (z_min >
   z_max, zd_max or dt negative),
   ROLN_E_ILL_CONDITIONED (Psi^T Phi is not I: no left inverse): numbers is untouched. */
ROLN_FN roln_status roln_unpack(const roln_model *md, int count, const unsigned char *bytes, void *numbers)
{
    const int n = md->lnn.n, own = rolni_own(md), params = roln_params(md), at = ROLN_NUMBERS(own, n, 0); /* of theta[0] */
    unsigned char head[ROLNI_HEAD];
    const int lead = rolni_pack_head(md, head);
    const int total = ROLN_PACKED(md->ae.layers, md->lnn.mass_net.layers, md->lnn.layers, md->lnn.angles, own, n, params);
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
    if (rolni_packed_at(p, 1) != rolni_bits(md->lnn.least)) return ROLN_E_SHAPE;
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

#ifndef ROLN_DOUBLE
/* theta of md, whose weights are stored small, from the same model with ROLN_FULL. Status of roln_ae_store; theta is untouched
   unless ROLN_OK. work [ROLN_AE_STORE_WORK]. */
ROLN_FN roln_status roln_store(const roln_model *md, const roln_trained *from, roln_real *theta, roln_real *work)
{
    const int at = roln_ae_params(&md->ae), rest = roln_params(md) - at;
    const roln_real *net = rolni_net(from);
    roln_status st;
    if (!roln_all_finite(rest, net)) return ROLN_E_NOT_FINITE;
    st = roln_ae_store(&md->ae, from->theta, from->z_min, from->z_max, theta, work);
    if (st == ROLN_OK) rolni_copy(rest, net, theta + at);
    return st;
}
#endif

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

/* One for every option that C can compare where the text is compiled, and for the format. Slope and least are numbers. */
ROLN_FN void rolni_write_needs(const rolni_text *t, const roln_model *md)
{
    static const char *const scheme[] = {"", "euler", "rk4", "midpoint"}, *const mass[] = {"exponential", "cholesky"};
    static const char *const store[] = {"full", "int8", "half"}, *const layer[] = {"0", "gyro"};
    static const char *const sizes[] = {"N", "N1", "N2", "N3", "N4", "N5", "N6", "N7", "N8"};
    static const char *const widths[] = {"H1", "H2", "H3", "H4", "H5"}, *const layers[] = {"L0", "L1", "L2", "L3"};
    static const char *const others[] = {"scheme", "degree", "cholesky", "base", "damping", "inputs", "stored", "twice", "angles",
                                         "friction", "own", "format"}, *const unit[] = {"common", "each"};
    const roln_lnn *f = &md->lnn;
    const int stored = rolni_ae_bits(&md->ae) / 8, twice = sizeof(roln_real) == 8;
    int other[12], hidden[ROLN_MLP_MAX - 1] = {0}, kind[ROLN_LAYERS_MAX] = {0}, l;
    char angles[ROLNI_ANGLES_TEXT];
    other[0] = md->scheme, other[1] = md->ae.degree, other[2] = f->mass, other[3] = f->base, other[4] = f->damping;
    other[5] = md->inputs, other[6] = stored, other[7] = twice, other[8] = ROLNI_AS(int, f->angles);
    other[9] = f->friction, other[10] = md->own, other[11] = ROLN_FORMAT;
    for (l = 1; l < f->mass_net.layers; l++)
        hidden[l - 1] = f->mass_net.size[l];
    for (l = 0; l < f->layers; l++)
        kind[l] = ROLN_GYRO;
    rolni_write_need(t, "AE", ROLN_AE_MAX + 1, sizes, NULL, md->ae.size);
    rolni_write_need(t, "MLP", ROLN_MLP_MAX - 1, widths, NULL, hidden);
    rolni_write_need(t, "STEP", 1, others, scheme, other);
    rolni_write_need(t, md->ae.degree > 0 ? "CHART_polynomial" : "CHART_none", 1, others + 1, NULL, other + 1);
    rolni_write_need(t, "MASS", 1, others + 2, mass, other + 2);
    rolni_write_need(t, "BASE", 1, others + 3, NULL, other + 3);
    rolni_write_need(t, "LAYERS", ROLN_LAYERS_MAX, layers, layer, kind);
    rolni_write_need(t, "DAMPING", 1, others + 4, NULL, other + 4);
    rolni_write_need(t, "FRICTION", 1, others + 9, NULL, other + 9);
    rolni_write_need(t, rolni_angles_text(f, angles), 1, others + 8, NULL, other + 8);
    rolni_write_need(t, "SCALE", 1, others + 10, unit, other + 10);
    rolni_write_need(t, "INPUTS", 1, others + 5, NULL, other + 5);
    rolni_write_need(t, "STORE", 1, others + 6, store, other + 6);
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
   least, or of a model with angles of which scale.q or each is not 1; ROLN_E_NOT_FINITE. Nothing is put then. */
ROLN_FN roln_status roln_write(const roln_model *md, const char *name, const void *numbers, roln_put put, void *ctx)
{
    const unsigned char *p = ROLNI_AS(const unsigned char *, numbers);
    const int n = md->lnn.n, own = rolni_own(md), from = 6 + own, at = ROLN_NUMBERS(own, n, 0), count = at + roln_params(md);
    const int words = rolni_ae_bits(&md->ae) > 0;
    const rolni_text text = {name, put, ctx}, *const t = &text;
    int i;
    if (rolni_word_at(p, 0) != rolni_bits(md->ae.slope) || rolni_word_at(p, 1) != rolni_bits(md->lnn.least)) return ROLN_E_SHAPE;
    if (md->lnn.angles && rolni_word_at(p, 2) != rolni_bits(1)) return ROLN_E_SHAPE;
    for (i = 0; i < own; i++)
        if (roln_lnn_angle(&md->lnn, i) && rolni_word_at(p, 5 + i) != rolni_bits(1)) return ROLN_E_SHAPE;
    for (i = 0; i < count; i++)
        if ((i < at || roln_ae_is_number(&md->ae, i - at)) && !roln_finite(rolni_real(rolni_word_at(p, i))))
            return ROLN_E_NOT_FINITE;
    rolni_write_name(t, "/* Include after the definition of the model. With ROLN_WEIGHTS_EXTERN defined ", "weights",
                     " is only declared here;\n   the one file of the program that defines ROLN_WEIGHTS_HERE, too, has it. */\n");
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

/* ---- 10 the typed shell: macros ---------------------------------------------------------------- */

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
#define ROLNI_SCHEME_(s) ROLNI_SCHEME_##s
#define ROLNI_SCHEME(s) ROLNI_SCHEME_(s)
#define ROLNI_MASS_exponential ROLN_EXPONENTIAL
#define ROLNI_MASS_cholesky ROLN_CHOLESKY
#define ROLNI_MASS_(s) ROLNI_MASS_##s
#define ROLNI_MASS_KIND(s) ROLNI_MASS_(s)
#define ROLNI_KIND_0 0
#define ROLNI_KIND_gyro ROLN_GYRO
#define ROLNI_KIND_(s) ROLNI_KIND_##s
#define ROLNI_KIND(s) ROLNI_KIND_(s)
#define ROLNI_STORE_full ROLN_FULL
#define ROLNI_STORE_half &roln_half
#define ROLNI_STORE_int8 &roln_int8
#define ROLNI_STORE_(s) ROLNI_STORE_##s
#define ROLNI_STORE(s) ROLNI_STORE_(s)
#define ROLNI_BITS_full 0
#define ROLNI_BITS_half 16
#define ROLNI_BITS_int8 8
#define ROLNI_BITS_(s) ROLNI_BITS_##s
#define ROLNI_BITS(s) ROLNI_BITS_(s)
#define ROLNI_LEARN_networks 1
#define ROLNI_LEARN_everything 0
#define ROLNI_LEARN_(s) ROLNI_LEARN_##s
#define ROLNI_LEARN(s) ROLNI_LEARN_(s)
#define ROLNI_OWN_common 0
#define ROLNI_OWN_each 1
#define ROLNI_OWN_(s) ROLNI_OWN_##s
#define ROLNI_OWN(s) ROLNI_OWN_(s)
#define ROLNI_CHART_none ROLN_UNBENT
#define ROLNI_CHART_polynomial &roln_polynomial
#define ROLNI_CHART_(s) ROLNI_CHART_##s
#define ROLNI_CHART(s) ROLNI_CHART_(s)
#define ROLNI_BENDS_none 0
#define ROLNI_BENDS_polynomial 1
#define ROLNI_BENDS_(s) ROLNI_BENDS_##s
#define ROLNI_BENDS(s) ROLNI_BENDS_(s)
#define ROLNI_OR(a, b) ((a) > 0 ? (a) : (b))
#define ROLNI_BEFORE(a, b, c, other) ((c) > 0 ? (b) : (b) > 0 ? (a) : (other)) /* of the last size of a, b, c the one before it */
#define ROLNI_(name) ROLNI_CAT(ROLN_NAME, name)
/* Work that stands in several of the macros above, which ask S for it by name: each doubles what it takes the maximum of, and a
   model would be megabytes to compile. state_work, load_work: linear_work of the filter, which wants no derivatives by
   forces, or those by a load; noise_work: filter_work without one. */
#define ROLN_PARTS(X, S) \
    X(linear_work, ROLNI_LINEAR_WORK(S, S(force_size))) X(state_work, ROLNI_LINEAR_WORK(S, 0)) X(cost_work, ROLNI_COST_WORK(S)) \
    X(load_work, ROLNI_LINEAR_WORK(S, S(n))) X(filter_work, ROLN_FILTER_WORK(S, S(load))) X(noise_work, ROLN_FILTER_WORK(S, 0)) \
    X(control_work, ROLN_CONTROL_WORK(S)) X(guard_work, ROLN_GUARD_WORK(S))
#define ROLNI_ENUMERATOR(name, size) ROLNI_(name) = (size),
#define ROLNI_ASSERT(what, truth) typedef char ROLNI_(what)[(truth) ? 1 : -1];
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
#define ROLNI_LEAST_IS_ABOVE_0(least) ROLNI_TRUE(ROLNI_IS_ABOVE_0(ROLNI_AS(roln_real, least)))
/* F of each of the eight layers that an autoencoder may have, N -> n, n = 0 where there is none. */
#define ROLNI_EACH_LAYER(F, join) \
    F(ROLNI_(N), ROLNI_(N1)) join F(ROLNI_(N1), ROLNI_(N2)) join F(ROLNI_(N2), ROLNI_(N3)) join F(ROLNI_(N3), ROLNI_(N4)) join \
    F(ROLNI_(N4), ROLNI_(N5)) join F(ROLNI_(N5), ROLNI_(N6)) join F(ROLNI_(N6), ROLNI_(N7)) join F(ROLNI_(N7), ROLNI_(N8))
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
#define ROLNI_LAYER(N, n) ((n) > 0 ? ROLN_AE_LAYER(ROLNI_BITS(ROLN_STORE), N, n) : 0)
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

/* ---- 10 the typed shell ------------------------------------------------------------------------ */

#ifdef ROLN_NAME

#include "roln_spd.h" /* asks again whether ROLN_DOUBLE is what it was */
#ifndef ROLN_AE
#error "ROLN_AE: the sizes of the autoencoder, such as 16, 12, 8, 4"
#endif
#ifndef ROLN_MLP
#error "ROLN_MLP: the hidden widths of the networks, such as 64, 64"
#endif
#ifndef ROLN_STEP
#define ROLN_STEP rk4
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
#ifndef ROLN_LEAST
#define ROLN_LEAST 1e-4
#endif
#ifndef ROLN_DAMPING
#define ROLN_DAMPING 0
#endif
#ifndef ROLN_FRICTION
#define ROLN_FRICTION 0
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
#ifndef ROLN_HORIZON
#define ROLN_HORIZON 8
#endif
#ifndef ROLN_BLOCK
#define ROLN_BLOCK 16
#endif
#ifndef ROLN_STORE
#define ROLN_STORE full
#endif
#ifndef ROLN_ROWS
#define ROLN_ROWS 0
#endif
#ifndef ROLN_PLAN
#define ROLN_PLAN 0
#endif
#ifndef ROLN_LEARN
#define ROLN_LEARN networks
#endif
#ifndef ROLN_LOAD
#define ROLN_LOAD 0
#endif

/* Sizes. N, n: full and latent degrees of freedom; force_size: numbers of a force; theta_size: trained parameters; packed_size:
   bytes of NAME_pack; horizon: longest training window in steps. */
ROLNI_INTS
    ROLNI_(N) = ROLNI_AT(0, ROLN_AE),
    ROLNI_(N1) = ROLNI_AT(1, ROLN_AE),
    ROLNI_(N2) = ROLNI_AT(2, ROLN_AE),
    ROLNI_(N3) = ROLNI_AT(3, ROLN_AE),
    ROLNI_(N4) = ROLNI_AT(4, ROLN_AE),
    ROLNI_(N5) = ROLNI_AT(5, ROLN_AE),
    ROLNI_(N6) = ROLNI_AT(6, ROLN_AE),
    ROLNI_(N7) = ROLNI_AT(7, ROLN_AE),
    ROLNI_(N8) = ROLNI_AT(8, ROLN_AE),
    ROLNI_(ae_layers) = (ROLNI_(N1) > 0) + (ROLNI_(N2) > 0) + (ROLNI_(N3) > 0) + (ROLNI_(N4) > 0) + (ROLNI_(N5) > 0) +
                     (ROLNI_(N6) > 0) + (ROLNI_(N7) > 0) + (ROLNI_(N8) > 0),
    ROLNI_(ae_sum) = ROLNI_(N1) + ROLNI_(N2) + ROLNI_(N3) + ROLNI_(N4) + ROLNI_(N5) + ROLNI_(N6) + ROLNI_(N7) + ROLNI_(N8),
    ROLNI_(n4) = ROLNI_OR(ROLNI_(N4), ROLNI_OR(ROLNI_(N3), ROLNI_OR(ROLNI_(N2), ROLNI_OR(ROLNI_(N1), ROLNI_(N))))),
    ROLNI_(n) = ROLNI_OR(ROLNI_(N8), ROLNI_OR(ROLNI_(N7), ROLNI_OR(ROLNI_(N6), ROLNI_OR(ROLNI_(N5), ROLNI_(n4))))),
    /* the bent layer: size of its input, degree and number of its polynomials */
    ROLNI_(degree) = ROLNI_AT(1, ROLN_CHART),
    ROLNI_(outer) = ROLNI_BEFORE(ROLNI_(N6), ROLNI_(N7), ROLNI_(N8), ROLNI_BEFORE(ROLNI_(N4), ROLNI_(N5), ROLNI_(N6),
                    ROLNI_BEFORE(ROLNI_(N2), ROLNI_(N3), ROLNI_(N4), ROLNI_BEFORE(ROLNI_(N), ROLNI_(N1), ROLNI_(N2), 0)))),
    ROLNI_(bent) = ROLNI_(degree) > 0 ? ROLNI_(outer) : 0,
    ROLNI_(curves) = ROLN_CURVES(ROLNI_(n), ROLNI_(degree)),
    ROLNI_(ae_size) = ROLNI_EACH_LAYER(ROLNI_LAYER, +) + ROLNI_(curves) * ROLN_AE_ROW(ROLNI_BITS(ROLN_STORE), ROLNI_(bent)),
    /* perceptrons: hidden sizes; weights without the output layer */
    ROLNI_(H1) = ROLNI_AT(0, ROLN_MLP),
    ROLNI_(H2) = ROLNI_AT(1, ROLN_MLP),
    ROLNI_(H3) = ROLNI_AT(2, ROLN_MLP),
    ROLNI_(H4) = ROLNI_AT(3, ROLN_MLP),
    ROLNI_(H5) = ROLNI_AT(4, ROLN_MLP),
    ROLNI_(mlp_layers) = 1 + (ROLNI_(H1) > 0) + (ROLNI_(H2) > 0) + (ROLNI_(H3) > 0) + (ROLNI_(H4) > 0) + (ROLNI_(H5) > 0),
    ROLNI_(hidden) = ROLNI_(H1) + ROLNI_(H2) + ROLNI_(H3) + ROLNI_(H4) + ROLNI_(H5),
    ROLNI_(angles) = ROLNI_TOTAL(ROLNI_BIT, ROLN_ANGLES), /* bits */
    ROLNI_(cossin) = ROLNI_(angles) == 0 ? 0 : ROLNI_(n) + ROLNI_TOTAL(ROLNI_ONE, ROLN_ANGLES),
    ROLNI_(into) = ROLNI_OR(ROLNI_(cossin), ROLNI_(n)), /* inputs */
    ROLNI_(even) = ROLN_MAX(ROLNI_(into), ROLN_MAX(ROLNI_(H2), ROLNI_(H4))),
    ROLNI_(odd) = ROLN_MAX(ROLNI_(H1), ROLN_MAX(ROLNI_(H3), ROLNI_(H5))),
    ROLNI_(wide) = ROLNI_(even) + ROLNI_(odd),
    ROLNI_(last) = ROLNI_OR(ROLNI_(H5), ROLNI_OR(ROLNI_(H4), ROLNI_OR(ROLNI_(H3), ROLNI_OR(ROLNI_(H2), ROLNI_(H1))))),
    ROLNI_(trunk) = (ROLNI_(into) + 1) * ROLNI_(H1) + (ROLNI_(H1) + 1) * ROLNI_(H2) + (ROLNI_(H2) + 1) * ROLNI_(H3) +
                    (ROLNI_(H3) + 1) * ROLNI_(H4) + (ROLNI_(H4) + 1) * ROLNI_(H5),
    /* SPD layers: kinds */
    ROLNI_(L0) = ROLNI_KIND(ROLNI_AT(0, ROLN_LAYERS)),
    ROLNI_(L1) = ROLNI_KIND(ROLNI_AT(1, ROLN_LAYERS)),
    ROLNI_(L2) = ROLNI_KIND(ROLNI_AT(2, ROLN_LAYERS)),
    ROLNI_(L3) = ROLNI_KIND(ROLNI_AT(3, ROLN_LAYERS)),
    ROLNI_(layers) = (ROLNI_(L0) > 0) + (ROLNI_(L1) > 0) + (ROLNI_(L2) > 0) + (ROLNI_(L3) > 0),
    ROLNI_(W0) = ROLNI_(n), /* weights that NAME_write wrote before 0.4.0 ask for it, such as tests/control/rope_weights.h */
    ROLNI_(tri) = ROLN_TRI(ROLNI_(n)),
    ROLNI_(base) = ROLN_BASE,
    ROLNI_(damping) = ROLN_DAMPING,
    ROLNI_(friction) = ROLN_FRICTION,
    ROLNI_(cholesky) = ROLNI_MASS_KIND(ROLN_MASS) == ROLN_CHOLESKY,
    ROLNI_(formed) = ROLNI_(layers) > 0 || ROLNI_(cholesky),
    ROLN_LNN_ROWS(ROLNI_ENUMERATOR, ROLNI_)
    /* parameters, and what training adds to them */
    ROLNI_(net_size) = 2 * ROLNI_(trunk) + (ROLNI_(last) + 1) * (ROLNI_(tri) + 1) +
                       ((ROLN_DAMPING) ? ROLNI_(trunk) + (ROLNI_(last) + 1) * ROLN_TRI(ROLNI_(n)) : 0) +
                       ((ROLN_FRICTION) ? 2 * ROLNI_(n) : 0),
    ROLNI_(base_size) = (ROLN_BASE) > 0 ? ROLNI_(n) * ROLNI_(n) : 0,
    ROLNI_(own) = ROLNI_OWN(ROLN_SCALE), /* 1: joints have units of their own */
    ROLNI_(inputs) = ROLN_INPUTS,
    ROLNI_(input_size) = ROLNI_(N) * (ROLN_INPUTS),
    ROLNI_(force_size) = ROLNI_OR(ROLN_INPUTS, ROLNI_(N)),
    ROLNI_(rest_size) = ROLNI_(net_size) + ROLNI_(base_size) + ROLNI_(layers) * (ROLNI_(tri) + ROLNI_(n) * ROLNI_(n)) +
                        ROLNI_(input_size),
    ROLNI_(theta_size) = ROLNI_(ae_size) + ROLNI_(rest_size),
    ROLNI_(bend_size) = ROLNI_(curves) * ROLNI_(bent),
    ROLNI_(full_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_FULL, +) + ROLNI_(bend_size) + ROLNI_(rest_size), /* none stored small */
    ROLNI_(moment_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_MOMENTS, +) + ROLNI_(bend_size) + ROLNI_(net_size) + (ROLN_BASE ? 1 : 0) +
                          ROLNI_(layers) * (ROLNI_(tri) + 1) + ROLNI_(input_size),
    ROLNI_(keep_size) = ROLNI_EACH_LAYER(ROLNI_LAYER_UPDATE, +) + (ROLN_BASE ? 2 * ROLNI_(base_size) + 2 : 0) +
                        ROLNI_(layers) * (2 * ROLNI_(n) * ROLNI_(n) + 2),
    ROLNI_(steps) = ROLNI_AT(0, ROLN_PLAN),
    ROLNI_(motors) = ROLNI_AT(1, ROLN_PLAN),
    ROLNI_(newton_size) = ROLNI_LEARN(ROLN_LEARN) ? ROLNI_(rest_size) : ROLNI_(theta_size), /* parameters that Gauss-Newton moves */
    ROLNI_(newton_side) = ROLN_NEWTON_SIDE(ROLN_ROWS, ROLNI_(newton_size)),
    ROLNI_(horizon) = ROLN_HORIZON,
    ROLNI_(load) = ROLN_LOAD,
    ROLNI_(side) = ROLNI_FILTER_SIDE(ROLNI_, ROLN_LOAD), /* numbers that a filter estimates */
    ROLNI_(scheme) = ROLNI_SCHEME(ROLN_STEP),
    ROLNI_(stored) = ROLNI_BITS(ROLN_STORE) / 8, /* 1: int8, 2: half */
    ROLNI_(twice) = sizeof(roln_real) == 8,
    ROLNI_(format) = ROLN_FORMAT,
    ROLN_GRAD_STEPS(ROLNI_ENUMERATOR, ROLNI_, ROLN_BLOCK)
    ROLN_PARTS(ROLNI_ENUMERATOR, ROLNI_)
    ROLNI_(packed_size) = ROLN_PACKED(ROLNI_(ae_layers), ROLNI_(mlp_layers), ROLNI_(layers), ROLNI_(angles),
                                       ROLNI_(own) * ROLNI_(N), ROLNI_(n), ROLNI_(theta_size)),
    ROLNI_(full_packed_size) = ROLN_PACKED(ROLNI_(ae_layers), ROLNI_(mlp_layers), ROLNI_(layers), ROLNI_(angles),
                                            ROLNI_(own) * ROLNI_(N), ROLNI_(n), ROLNI_(full_size))
ROLNI_INTS_END;

ROLNI_ASSERT(sizes_must_be_at_least_1,
             ROLNI_GIVEN(0, ROLN_AE) && ROLNI_GIVEN(1, ROLN_AE) && ROLNI_GIVEN(2, ROLN_AE) && ROLNI_GIVEN(3, ROLN_AE) &&
                 ROLNI_GIVEN(4, ROLN_AE) && ROLNI_GIVEN(5, ROLN_AE) && ROLNI_GIVEN(6, ROLN_AE) && ROLNI_GIVEN(7, ROLN_AE) &&
                 ROLNI_GIVEN(8, ROLN_AE))
ROLNI_ASSERT(sizes_must_not_grow, (ROLNI_EACH_LAYER(ROLNI_LAYER_OK, &&)) && ROLNI_AT(9, ROLN_AE) == 0)
ROLNI_ASSERT(chart_is_none_or_of_degree_2_to_8,
             (ROLNI_BENDS(ROLNI_AT(0, ROLN_CHART)) ? ROLNI_(degree) >= 2 && ROLNI_(degree) <= ROLN_DEGREE_MAX
                                                   : ROLNI_(degree) == 0) && ROLNI_AT(2, ROLN_CHART) == 0)
ROLNI_ASSERT(chart_needs_a_layer_that_reduces, ROLNI_(degree) == 0 || ROLNI_(n) < ROLNI_(outer))
ROLNI_ASSERT(cholesky_takes_no_base_nor_layers, !ROLNI_(cholesky) || (ROLNI_(layers) == 0 && !(ROLN_BASE)))
ROLNI_ASSERT(spd_layers_4_at_most, (ROLNI_(L1) == 0 || ROLNI_(L0) > 0) && (ROLNI_(L2) == 0 || ROLNI_(L1) > 0) &&
                                       (ROLNI_(L3) == 0 || ROLNI_(L2) > 0) && ROLNI_KIND(ROLNI_AT(4, ROLN_LAYERS)) == 0)
ROLNI_ASSERT(mlp_needs_1_to_5_widths, ROLNI_GIVEN(0, ROLN_MLP) && ROLNI_GIVEN(1, ROLN_MLP) && ROLNI_GIVEN(2, ROLN_MLP) &&
                                          ROLNI_GIVEN(3, ROLN_MLP) && ROLNI_GIVEN(4, ROLN_MLP) && ROLNI_AT(5, ROLN_MLP) == 0)
ROLNI_ASSERT(sizes_fit_the_packed_format, ROLNI_(N) < 65536 && ROLNI_(wide) < 65536)
ROLNI_ASSERT(angles_are_0_or_1_for_each_joint,
             ROLNI_TOTAL(ROLNI_NO_BIT, ROLN_ANGLES) == 0 &&
                 (ROLNI_COUNT(ROLN_ANGLES) == ROLNI_(N) || (ROLNI_COUNT(ROLN_ANGLES) == 1 && ROLNI_(angles) == 0)))
ROLNI_ASSERT(angles_need_a_model_without_autoencoder, ROLNI_(angles) == 0 || ROLNI_(ae_layers) == 0)
ROLNI_ASSERT(angles_need_31_joints_at_most, ROLNI_(angles) == 0 || ROLNI_(N) <= ROLN_ANGLES_MAX)
ROLNI_ASSERT(inputs_at_most_N, (ROLN_INPUTS) >= 0 && (ROLN_INPUTS) <= ROLNI_(N))
ROLNI_ASSERT(base_and_damping_are_0_or_1,
             (ROLN_BASE) * (ROLN_BASE) == (ROLN_BASE) && (ROLN_DAMPING) * (ROLN_DAMPING) == (ROLN_DAMPING))
ROLNI_ASSERT(friction_is_0_or_1, (ROLN_FRICTION) * (ROLN_FRICTION) == (ROLN_FRICTION))
ROLNI_ASSERT(load_is_0_or_1, (ROLN_LOAD) * (ROLN_LOAD) == (ROLN_LOAD))
ROLNI_ASSERT(block_at_least_1, (ROLN_BLOCK) >= 1)
ROLNI_ASSERT(horizon_at_least_1, (ROLN_HORIZON) >= 1)
ROLNI_ASSERT(rows_must_not_be_negative, (ROLN_ROWS) >= 0)
ROLNI_ASSERT(plan_must_be_steps_and_motors,
             ROLNI_(steps) == 0 ? ROLNI_(motors) == 0 : ROLNI_(steps) > 0 && ROLNI_(motors) > 0 && ROLNI_AT(2, ROLN_PLAN) == 0)
ROLNI_ASSERT(motors_must_not_be_more_than_joints, ROLNI_(motors) <= ROLN_MAX(ROLNI_(N), ROLNI_(force_size)))
ROLNI_ASSERT(stored_weights_need_float, ROLNI_BITS(ROLN_STORE) == 0 || sizeof(roln_real) == 4)

/* Parameters: const in flash for inference. slope, least: of the config that they belong to, without which every function that
   evaluates the model returns ROLN_E_SHAPE; each: with ROLN_SCALE each; dt: step used in training, s; z_min, z_max, zd_max: range
   seen in training. */
typedef struct {
    roln_real slope, least;
    roln_scale scale;
#if ROLNI_OWN(ROLN_SCALE)
    roln_real each[ROLNI_(N)];
#endif
    roln_real dt, z_min[ROLNI_(n)], z_max[ROLNI_(n)], zd_max[ROLNI_(n)];
    roln_real theta[ROLNI_(theta_size)];
} ROLNI_(params);
ROLNI_ASSERT(params_are_numbers_only,
             sizeof(ROLNI_(params)) == ROLN_NUMBERS(ROLNI_(own) * ROLNI_(N), ROLNI_(n), ROLNI_(theta_size)) * sizeof(roln_real))

/* The own units of the joints in p; without ROLN_SCALE each there are none. */
#if ROLNI_OWN(ROLN_SCALE)
#define ROLNI_EACH(p) (p)->each
#else
#define ROLNI_EACH(p) NULL
#endif

typedef struct { roln_real q[ROLNI_(N)], qd[ROLNI_(N)]; } ROLNI_(state);  /* full state: q, and qd in units of q per second */
typedef struct { roln_real z[ROLNI_(n)], zd[ROLNI_(n)]; } ROLNI_(latent); /* latent state; z = 0 is no special pose */
typedef struct {
    roln_real z[ROLNI_(n)], zd[ROLNI_(n)], zdd[ROLNI_(n)], kp[ROLNI_(n)], kd[ROLNI_(n)];
#if ROLN_LOAD > 0
    const roln_real *load; /* [n] that PD+ works against, such as that of NAME_filter; NULL: none */
#endif
} ROLNI_(target);
typedef struct { roln_guard g; roln_real tau[ROLNI_(force_size)]; } ROLNI_(guard); /* zero it once; tau: to be applied */
typedef struct { roln_real M[ROLNI_(n) * ROLNI_(n)], c[ROLNI_(n)], g[ROLNI_(n)], d[ROLNI_(n)], T, V; } ROLNI_(equation);
typedef struct { roln_real A[4 * ROLNI_(n) * ROLNI_(n)], B[2 * ROLNI_(n) * ROLNI_(force_size)]; } ROLNI_(jacobian);
/* zero it once; s, load: the estimate, F^T F: the covariance of its error */
typedef struct {
    roln_filter f;
    ROLNI_(latent) s;
#if ROLN_LOAD > 0
    roln_real load[ROLNI_(n)];
#endif
    roln_real F[ROLNI_(side) * ROLNI_(side)];
} ROLNI_(filter);

/* Where there is a load. */
#if ROLN_LOAD > 0
#define ROLNI_LOAD_OF(x) (x)->load
#else
#define ROLNI_LOAD_OF(x) NULL
#endif

#if ROLNI_AT(0, ROLN_PLAN) > 0
/* zero it once; the plan: states, torques, feedback */
typedef struct {
    roln_plan plan;
    ROLNI_(latent) s[ROLNI_(steps) + 1];
    roln_real u[ROLNI_(steps) * ROLNI_(motors)], K[ROLNI_(steps) * ROLNI_(motors) * 2 * ROLNI_(n)];
} ROLNI_(plan);
#endif

/* Scratch of prediction and control: for every function what it takes, one upon the other. */
typedef union {
    roln_real encode[ROLN_ENCODE_WORK(ROLNI_, 2)], aim[ROLN_ENCODE_WORK(ROLNI_, 3)], decode[ROLN_DECODE_WORK(ROLNI_)];
    roln_real decode_some[ROLN_DECODE_SOME_WORK(ROLNI_)], step[ROLN_STEP_WORK(ROLNI_)], reduce[ROLN_REDUCE_WORK(ROLNI_)];
    roln_real lift[ROLN_LIFT_WORK(ROLNI_)], terms[ROLN_TERMS_WORK(ROLNI_)], inverse[ROLN_INVERSE_WORK(ROLNI_)];
    roln_real inertia[ROLN_INERTIA_WORK(ROLNI_)], control[ROLNI_(control_work)], allocate[ROLN_ALLOCATE_WORK(ROLNI_)];
    roln_real gains[ROLN_GAINS_WORK(ROLNI_)], guard_tick[ROLNI_(guard_work)], fit_range[ROLN_FIT_RANGE_WORK(ROLNI_)];
    roln_real tick[ROLN_TICK_WORK(ROLNI_)];
} ROLNI_(work);
/* scratch of linearisation */
typedef union { roln_real linear[0 ROLNI_TURNED_MEM(ROLNI_SIZE, ROLNI_) + ROLNI_(linear_work)]; } ROLNI_(linwork);
typedef union { /* of feedback of least cost */
    roln_real lqr[ROLN_LQR_WORK(ROLNI_)], lqr_along[ROLN_LQR_ALONG_WORK(ROLNI_)];
} ROLNI_(lqrwork);
typedef union { roln_real filter_tick[ROLNI_(filter_work)]; } ROLNI_(filterwork); /* of a Kalman filter */
#if ROLNI_AT(0, ROLN_PLAN) > 0
typedef union { /* of plans */
    roln_real plan_next[ROLN_PLAN_WORK(ROLNI_)], plan_linear[ROLN_PLAN_LINEAR_WORK(ROLNI_)];
} ROLNI_(planwork);
#endif

#define ROLNI_MLP_OF(out) \
    {ROLNI_(mlp_layers), \
     {ROLNI_(into), ROLNI_(H1), ROLNI_OR(ROLNI_(H2), out), ROLNI_OR(ROLNI_(H3), out), ROLNI_OR(ROLNI_(H4), out), \
      ROLNI_OR(ROLNI_(H5), out), out}}
static const roln_model ROLNI_(model) = {
    {ROLNI_(ae_layers),
     {ROLNI_(N) * ROLNI_SLOPE_IS_ABOVE_0_AND_AT_MOST_1(ROLN_SLOPE), ROLNI_(N1), ROLNI_(N2), ROLNI_(N3), ROLNI_(N4), ROLNI_(N5),
      ROLNI_(N6), ROLNI_(N7), ROLNI_(N8)},
     ROLNI_AS(roln_real, ROLN_SLOPE), ROLNI_STORE(ROLN_STORE), ROLNI_CHART(ROLNI_AT(0, ROLN_CHART)), ROLNI_(degree),
     ROLNI_(curves)},
    {ROLNI_(n) * ROLNI_LEAST_IS_ABOVE_0(ROLN_LEAST), ROLNI_MASS_KIND(ROLN_MASS), ROLN_BASE, ROLNI_(layers),
     ROLN_DAMPING, ROLNI_AS(roln_real, ROLN_LEAST),
     ROLNI_MLP_OF(ROLNI_(tri)), ROLNI_MLP_OF(1), ROLNI_MLP_OF(ROLN_TRI(ROLNI_(n))), ROLNI_(angles), ROLN_FRICTION},
    ROLNI_SCHEME(ROLN_STEP), ROLN_INPUTS, ROLNI_(own)};
#undef ROLNI_MLP_OF

/* The model and where its numbers are, as the functions above want it. */
ROLN_FN roln_trained ROLNI_(trained)(const ROLNI_(params) *p)
{
    const roln_trained m = {&ROLNI_(model), &p->scale, p->z_min, p->z_max, p->zd_max, p->theta, ROLNI_EACH(p)};
    return m;
}

/* Nonzero if the numbers are of another slope or least than the model that was compiled, or were never set; with angles also if
   their scale.q or each is not 1. */
ROLN_FN int ROLNI_(foreign)(const ROLNI_(params) *p)
{
    return !(p->slope == ROLNI_(model).ae.slope && p->least == ROLNI_(model).lnn.least &&
             (ROLNI_(angles) == 0 || (p->scale.q == 1 && rolni_each_turns(&ROLNI_(model), ROLNI_EACH(p)))));
}

/* z = rho(q), zd = D(q) qd. */
ROLN_FN roln_status ROLNI_(encode)(const ROLNI_(params) *p, const ROLNI_(state) *x, ROLNI_(latent) *s, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_encode(&m, x->q, x->qd, NULL, s->z, s->zd, NULL, work->encode);
}

/* q = phi(z), qd = J(z) zd. */
ROLN_FN roln_status ROLNI_(decode)(const ROLNI_(params) *p, const ROLNI_(latent) *s, ROLNI_(state) *x, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_decode(&m, s->z, s->zd, x->q, x->qd, work->decode);
}

/* q, qd [count] of the joints which[] only, each 0 .. N-1: cheaper (roln_decode_some). */
ROLN_FN roln_status ROLNI_(decode_some)(const ROLNI_(params) *p, const ROLNI_(latent) *s, int count, const int *which, roln_real *q,
                                        roln_real *qd, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_decode_some(&m, s->z, s->zd, count, which, q, qd, work->decode_some);
}

/* Reference q, qd, qdd [N] in the latent space: r->z, zd, zdd; the gains in r stay as they are. */
ROLN_FN roln_status ROLNI_(aim)(const ROLNI_(params) *p, const roln_real q[ROLN_AT_LEAST(ROLNI_(N))],
                                const roln_real qd[ROLN_AT_LEAST(ROLNI_(N))], const roln_real qdd[ROLN_AT_LEAST(ROLNI_(N))],
                                ROLNI_(target) *r, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_encode(&m, q, qd, qdd, r->z, r->zd, r->zdd, work->aim);
}

/* PD+: tau_z = M zdd_ref + C zd_ref + g + d - Kp (z - z_ref) - Kd (zd - zd_ref), reference and diagonal gains in r. */
ROLN_FN roln_status ROLNI_(control)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const ROLNI_(target) *r,
                                    roln_real tau_z[ROLN_AT_LEAST(ROLNI_(n))], ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_target ref = {r->z, r->zd, r->zdd, r->kp, r->kd, ROLNI_LOAD_OF(r)};
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_control(&m, s->z, s->zd, &ref, tau_z, work->control);
}

/* r->kp, kd from gains of the joints Kp [N] in Nm/rad, Kd [N] in Nms/rad at s: the diagonals of J^T Kp J, J^T Kd J. */
ROLN_FN roln_status ROLNI_(gains)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const roln_real Kp[ROLN_AT_LEAST(ROLNI_(N))],
                                  const roln_real Kd[ROLN_AT_LEAST(ROLNI_(N))], ROLNI_(target) *r, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_gains(&m, s->z, Kp, Kd, r->kp, r->kd, work->gains);
}

/* tau = D(phi(z))^T tau_z, the force on the joints that reduces to tau_z. */
ROLN_FN roln_status ROLNI_(lift)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const roln_real tau_z[ROLN_AT_LEAST(ROLNI_(n))],
                                 roln_real tau[ROLN_AT_LEAST(ROLNI_(N))], ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_lift(&m, s->z, tau_z, tau, work->lift);
}

/* Motors u [count], tau = B u, that come nearest to tau_z, by damped least squares; missed [1], may be NULL: the part of tau_z that
   they cannot make. motors NULL: the learned inputs. */
ROLN_FN roln_status ROLNI_(allocate)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const roln_motors *motors,
                                     const roln_real tau_z[ROLN_AT_LEAST(ROLNI_(n))], roln_real *u, roln_real *missed,
                                     ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_allocate(&m, s->z, motors, tau_z, u, missed, work->allocate);
}

/* Last call of a control tick: g->tau becomes the torque `want` [force_size], of limits->motors [count], if all is well, clipped to
   the limits; else it stays, and after limits->hold such ticks it is the safe one. s NULL: the encoder failed, or there is no
   estimate; want NULL: something on the way to it failed. Returns the faults of this tick, ROLN_FAULT_.., or ROLN_CLIPPED;
   g->g.faults keeps those of all ticks. */
ROLN_FN uint32_t ROLNI_(guard_tick)(const ROLNI_(params) *p, const roln_limits *limits, const ROLNI_(state) *x,
                                    const ROLNI_(latent) *s, const roln_real *want, ROLNI_(guard) *g, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_measured measured = {x->q, x->qd};
    const roln_held held = {&g->g, g->tau};
    if (ROLNI_(foreign)(p)) s = NULL; /* as if the encoder had failed */
    return roln_guard_tick(&m, limits, &measured, s ? s->z : NULL, s ? s->zd : NULL, want, &held, work->guard_tick);
}

/* All of a control tick: x measured, s its latent state out (as it was if the encoder fails), g->tau to the motors. encode,
   control, lift and guard_tick in one call, the same bits (but for r->load in the guard's residual), with the state decoded once
   and the networks evaluated once; where limits->motors or learned inputs are to make tau_z, allocate in place of lift, and
   g->g.missed. */
ROLN_FN uint32_t ROLNI_(tick)(const ROLNI_(params) *p, const roln_limits *limits, const ROLNI_(state) *x, const ROLNI_(target) *r,
                              ROLNI_(latent) *s, ROLNI_(guard) *g, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_measured measured = {x->q, x->qd};
    const roln_target ref = {r->z, r->zd, r->zdd, r->kp, r->kd, ROLNI_LOAD_OF(r)};
    const roln_held held = {&g->g, g->tau};
    if (ROLNI_(foreign)(p)) return ROLNI_(guard_tick)(p, limits, x, NULL, NULL, g, work);
    return roln_tick(&m, limits, &measured, &ref, s->z, s->zd, &held, work->tick);
}

/* Nonzero if z and zd lie in the range seen in training; NaN does not. */
ROLN_FN int ROLNI_(in_range)(const ROLNI_(params) *p, const ROLNI_(latent) *s)
{
    const roln_trained m = ROLNI_(trained)(p);
    return !ROLNI_(foreign)(p) && roln_in_range(&m, 0, s->z, s->zd);
}

/* Advance s by dt seconds under the force tau [N] (or inputs u) held over the step (NULL: none). s stays as it was unless
   ROLN_OK. */
ROLN_FN roln_status ROLNI_(step)(const ROLNI_(params) *p, ROLNI_(latent) *s, const roln_real tau[ROLNI_(force_size)], roln_real dt,
                                 ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_step(&m, s->z, s->zd, tau, dt, work->step);
}

/* The same, and j->A = d(z,zd)+ / d(z,zd) [2n][2n], j->B = d(z,zd)+ / d tau [2n][force_size]. */
ROLN_FN roln_status ROLNI_(linear)(const ROLNI_(params) *p, ROLNI_(latent) *s, const roln_real tau[ROLNI_(force_size)],
                                   roln_real dt, ROLNI_(jacobian) *j, ROLNI_(linwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_linear(&m, s->z, s->zd, tau, dt, j->A, j->B, work->linear);
}

/* Feedback of least cost about s, u_k = u - K (s_k - s): K [count][2n], count motors of cost, P [2n][2n] or NULL (roln_lqr). */
ROLN_FN roln_status ROLNI_(lqr)(const ROLNI_(params) *p, const roln_cost *cost, const ROLNI_(latent) *s, const roln_real *u,
                                roln_real *K, roln_real *P, ROLNI_(lqrwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_lqr(&m, cost, ROLNI_AS(const roln_real *, ROLNI_AS(const void *, s)), u, K, P, work->lqr);
}

/* The same along s [count + 1] and u [count][motors]: K [count][motors][2n]; P [2n][2n] the cost at the end, or NULL
   (roln_lqr_along). */
ROLN_FN roln_status ROLNI_(lqr_along)(const ROLNI_(params) *p, const roln_cost *cost, int count, const ROLNI_(latent) *s,
                                      const roln_real *u, const roln_real *P, roln_real *K, ROLNI_(lqrwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_lqr_along(&m, cost, count, ROLNI_AS(const roln_real *, ROLNI_AS(const void *, s)), u, P, K, work->lqr_along);
}

/* One tick of a Kalman filter: measured positions y [N], NaN: not measured, NULL: none, and the torque that was held since the last
   tick, NULL: none, give the estimate f->s and, with ROLN_LOAD, f->load. Returns ROLN_FILTER_.. and faults (roln_filter_tick);
   f->f.faults keeps the bits of all ticks. Parameters that are foreign: ROLN_FAULT_STATUS, and nothing is done. */
ROLN_FN uint32_t ROLNI_(filter_tick)(const ROLNI_(params) *p, const roln_noise *noise, const roln_real y[ROLNI_(N)],
                                     const roln_real tau[ROLNI_(force_size)], ROLNI_(filter) *f, ROLNI_(filterwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_estimate e = {&f->f, f->s.z, f->s.zd, f->F, ROLNI_LOAD_OF(f)};
    if (ROLNI_(foreign)(p)) return ROLN_FAULT_STATUS;
    return roln_filter_tick(&m, noise, y, tau, &e, work->filter_tick);
}

#if ROLNI_AT(0, ROLN_PLAN) > 0
/* Where the numbers of a plan are, for the kernels below the shell. */
ROLN_FN roln_planned ROLNI_(planned)(ROLNI_(plan) *plan)
{
    roln_planned pl;
    pl.plan = &plan->plan, pl.steps = ROLNI_(steps), pl.motors = ROLNI_(motors);
    pl.s = ROLNI_AS(roln_real *, ROLNI_AS(void *, plan->s)), pl.u = plan->u, pl.K = plan->K;
    return pl;
}

/* The next plan from s on, a step after the last one (roln_plan_next). Parameters that are foreign: nothing is done, the last
   plan does not become older. */
ROLN_FN roln_status ROLNI_(plan_next)(const ROLNI_(params) *p, const roln_goal *goal, const ROLNI_(latent) *s, ROLNI_(plan) *plan,
                                      ROLNI_(planwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_planned pl = ROLNI_(planned)(plan);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_plan_next(&m, goal, ROLNI_AS(const roln_real *, ROLNI_AS(const void *, s)), &pl, work->plan_next);
}

/* The torques u t seconds after the last call of NAME_plan_next, at the state s (roln_plan_follow). */
ROLN_FN roln_status ROLNI_(plan_follow)(const ROLNI_(params) *p, const roln_goal *goal, ROLNI_(plan) *plan, roln_real t,
                                        const ROLNI_(latent) *s, roln_real u[ROLN_AT_LEAST(ROLNI_(motors))])
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_planned pl = ROLNI_(planned)(plan);
    return roln_plan_follow(&m, goal, &pl, t, ROLNI_AS(const roln_real *, ROLNI_AS(const void *, s)), u);
}

/* The plan linearised, s_k+1 = A_k s_k + B_k u_k + c_k: A [steps][2n][2n], B [steps][2n][motors], c [steps][2n]
   (roln_plan_linear). */
ROLN_FN roln_status ROLNI_(plan_linear)(const ROLNI_(params) *p, const roln_goal *goal, ROLNI_(plan) *plan, roln_real *A,
                                        roln_real *B, roln_real *c, ROLNI_(planwork) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_planned pl = ROLNI_(planned)(plan);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_plan_linear(&m, goal, &pl, A, B, c, work->plan_linear);
}
#endif

/* tau_z = J(z)^T tau. tau [N] (or u). */
ROLN_FN roln_status ROLNI_(reduce)(const ROLNI_(params) *p, const ROLNI_(latent) *s,
                                   const roln_real tau[ROLN_AT_LEAST(ROLNI_(force_size))],
                                   roln_real tau_z[ROLN_AT_LEAST(ROLNI_(n))], ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_reduce(&m, s->z, tau, tau_z, work->reduce);
}

/* tau_z = M zdd + C(z, zd) w + g + d; w NULL: zd. */
ROLN_FN roln_status ROLNI_(inverse)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const roln_real w[ROLNI_(n)],
                                    const roln_real zdd[ROLN_AT_LEAST(ROLNI_(n))], roln_real tau_z[ROLN_AT_LEAST(ROLNI_(n))],
                                    ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_inverse(&m, s->z, s->zd, w, zdd, tau_z, work->inverse);
}

/* M [n][n], c = C zd, g, d of M zdd + c + g + d = tau_z, kinetic and potential energy T, V. If no force did work in training, all
   of them, and forces with them, share one unknown factor. */
ROLN_FN roln_status ROLNI_(terms)(const ROLNI_(params) *p, const ROLNI_(latent) *s, ROLNI_(equation) *e, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_terms_out out = {e->M, e->c, e->g, e->d, &e->T, &e->V};
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_terms(&m, s->z, s->zd, &out, work->terms);
}

#if ROLN_FRICTION > 0
/* The dry friction c_j tanh(zd_j / v_j) that was learned: c [n], in J, and v [n], in 1/s. Of a joint without autoencoder
   c / p->scale.q, in Nm, and v p->scale.q, in rad/s; with ROLN_SCALE each p->scale.q p->each[j] in place of p->scale.q. c, v are
   untouched on ROLN_E_NOT_FINITE. */
ROLN_FN roln_status ROLNI_(friction_of)(const ROLNI_(params) *p, roln_real c[ROLN_AT_LEAST(ROLNI_(n))],
                                        roln_real v[ROLN_AT_LEAST(ROLNI_(n))])
{
    const roln_trained m = ROLNI_(trained)(p);
    roln_real out[2 * ROLNI_(n)];
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    roln_friction(&m, out, out + ROLNI_(n));
    if (!roln_all_finite(2 * ROLNI_(n), out)) return ROLN_E_NOT_FINITE;
    rolni_copy(ROLNI_(n), out, c);
    rolni_copy(ROLNI_(n), out + ROLNI_(n), v);
    return ROLN_OK;
}
#else
ROLNI_ASSERT(friction_must_be_a_number_that_the_preprocessor_can_read, (ROLN_FRICTION) == 0)
#endif

/* y = D^T M D v, the apparent inertia of the full space applied to v. */
ROLN_FN roln_status ROLNI_(inertia)(const ROLNI_(params) *p, const ROLNI_(latent) *s, const roln_real v[ROLN_AT_LEAST(ROLNI_(N))],
                                    roln_real y[ROLN_AT_LEAST(ROLNI_(N))], ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_inertia(&m, s->z, v, y, work->inertia);
}

/* Record in p the range of z, zd over the samples q, qd [count][N]. */
ROLN_FN roln_status ROLNI_(fit_range)(ROLNI_(params) *p, int count, const roln_real *q, const roln_real *qd, ROLNI_(work) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_fit_range(&m, count, q, qd, p->z_min, p->z_max, p->zd_max, work->fit_range);
}

/* Parameters to and from bytes (roln_pack, roln_unpack), and as a C definition NAME_weights through put. */
ROLN_FN void ROLNI_(pack)(const ROLNI_(params) *p, unsigned char bytes[ROLN_AT_LEAST(ROLNI_(packed_size))])
{
    roln_pack(&ROLNI_(model), p, bytes);
}

ROLN_FN roln_status ROLNI_(unpack)(int count, const unsigned char *bytes, ROLNI_(params) *p)
{
    return roln_unpack(&ROLNI_(model), count, bytes, p);
}

ROLN_FN roln_status ROLNI_(write)(const ROLNI_(params) *p, roln_put put, void *ctx)
{
    return roln_write(&ROLNI_(model), ROLNI_STR(ROLN_NAME), p, put, ctx);
}

ROLNI_INTS ROLNI_(numbers) = sizeof(ROLNI_(params)) / sizeof(roln_real) ROLNI_INTS_END; /* of NAME_params */

/* Are the parameters in memory what they were? A CRC-32 over all of them, count numbers a call, so that a tick spends little on it:
   16 numbers take 480 instructions on a Cortex-M4F, all of them NAME_numbers / 16 calls. The first pass takes the reference:
   go through it at the start, NAME_check(p, NAME_numbers, c), when they have just been unpacked; or set c->reference, which is the
   same on every machine, and c->known = 1. A pass that ends otherwise, and every call from there on: ROLN_E_CHECKSUM
   (roln_check_step). All damage within 32 bits in a row is seen, and all of two bits anywhere; at the latest two passes after it
   was done. Parameters that learn: zero c whenever they have changed. */
ROLN_FN roln_status ROLNI_(check)(const ROLNI_(params) *p, int count, roln_check *c)
{
    return roln_check_step(ROLNI_(numbers), p, count, c);
}

/* Scratch of training, for every function what it takes, one upon the other. No function of prediction and control leaves anything
   in its scratch, so a program that trains between its ticks may put NAME_work and NAME_train into a union of its own. */
typedef union {
    roln_real errors[ROLN_ERRORS_WORK(ROLNI_, ROLN_BLOCK)], fit_limits[ROLN_FIT_LIMITS_WORK(ROLNI_)];
    roln_real fit_noise[ROLN_FIT_NOISE_WORK(ROLNI_)];
#if ROLNI_BITS(ROLN_STORE) == 0
    roln_real grad[ROLN_GRAD_WORK(ROLNI_, ROLN_BLOCK, ROLN_HORIZON)], grad_acc[ROLN_GRAD_ACC_WORK(ROLNI_, ROLN_BLOCK)];
    roln_real update[ROLN_MAX(1, ROLNI_(keep_size) + ROLNI_VERB_WORK(ROLNI_))], variance[ROLN_VARIANCE_WORK(ROLNI_)];
    roln_real fit_inertia[ROLN_FIT_INERTIA_WORK(ROLNI_)];
#endif
} ROLNI_(train);

/* Roll-out errors over windows of any length at steps 0, every, 2 every .. (roln_errors): e [b->steps / every + 1], and joints
   [b->steps / every + 1][N], NULL: not wanted. */
ROLN_FN roln_status ROLNI_(errors)(const ROLNI_(params) *p, const roln_batch *b, roln_real dt, int every,
                                   const roln_real qbar[ROLN_AT_LEAST(ROLNI_(N))], roln_error *e, roln_error *joints,
                                   ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_errors_to to = {e, joints};
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_errors(&m, b, dt, ROLN_BLOCK, every, qbar, &to, work->errors);
}

/* Limits from the recordings of good motion in b (roln_fit_limits): slack times what they need. l->dt, hold, window, strict and
   safe in; the rest of l, and with b->tau also tau_each, rate_each, to which l then points, out. */
ROLN_FN roln_status ROLNI_(fit_limits)(const ROLNI_(params) *p, const roln_batch *b, roln_real slack, roln_limits *l,
                                       roln_real tau_each[ROLN_AT_LEAST(ROLNI_(force_size))],
                                       roln_real rate_each[ROLN_AT_LEAST(ROLNI_(force_size))], ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_fit_limits(&m, b, slack, l, tau_each, rate_each, work->fit_limits);
}

/* Noise of a filter from the recordings in b, positions as they were measured, and torques (roln_fit_noise). noise->dt, gate, lost
   in; tau out, and where noise->q is 0 q_each, to which noise then points; else q_each may be NULL. */
ROLN_FN roln_status ROLNI_(fit_noise)(const ROLNI_(params) *p, const roln_batch *b, roln_noise *noise,
                                      roln_real q_each[ROLNI_(N)], ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_fit_noise(&m, b, noise, q_each, work->fit_noise);
}

#if ROLNI_BITS(ROLN_STORE) == 0

/* Gradient: sums over the windows of all calls since it was zeroed, to be divided by `windows`. Zero it whole before the first
   NAME_grad of an update. Calls add up as if in twice the digits: after a million windows a sum is still right to 200 eps of the
   largest number (held by test_sums.c). An array of numbers: gradients of other machines are added to it
   number by number. */
typedef struct {
    roln_real theta[ROLNI_(theta_size)];
    roln_loss loss; /* unweighted terms; roln_loss_total */
    roln_real windows;
    struct {
        roln_real theta[ROLNI_(theta_size)];
        roln_loss loss;
        roln_real windows;
    } rest; /* what these have lost by rounding */
} ROLNI_(gradient);

/* Optimiser state: zero it once. Saved and restored with the parameters it resumes bit for bit. */
typedef struct {
    roln_adam adam;
    roln_real m[ROLNI_(theta_size)], v[ROLNI_(moment_size)], v_max[ROLNI_(moment_size)];
} ROLNI_(optimiser);

/* Scratch of initialisation, and of charts in closed form. */
typedef union {
    roln_real init[ROLN_MAX(1, ROLN_AE_INIT_WORK(ROLNI_))];
    struct {
        double room[ROLN_MAX(1, ROLN_AE_POD_ROOM(ROLNI_))];
        roln_real work[ROLN_MAX(1, ROLN_AE_POD_WORK(ROLNI_))];
    } init_pod;
#if ROLNI_AT(1, ROLN_CHART) > 0
    struct {
        double room[ROLN_CHART_ADD_ROOM(ROLNI_)];
        roln_real work[ROLN_CHART_ADD_WORK(ROLNI_)];
    } chart_add;
    double chart_solve[ROLN_CHART_SOLVE_ROOM(ROLNI_)];
#endif
} ROLNI_(start);

/* The manifold of the parameters: per layer a biorthogonal pair (learning-rate group 0) and a bias (2), of a chart its polynomials
   (2), then the networks, the base point, the SPD layers, the input map (group 1). */
static const roln_block ROLNI_(table)[] = {ROLNI_EACH_LAYER(ROLNI_LAYER_BLOCKS, ROLNI_COMMA),
                                           {ROLN_EUCLIDEAN, ROLNI_(curves), ROLNI_(bent), 2},
                                           {ROLN_EUCLIDEAN, 1, ROLNI_(net_size), 1},
                                           {ROLN_BASE ? &roln_spd : ROLN_EUCLIDEAN, ROLN_BASE ? ROLNI_(n) : 0,
                                            ROLN_BASE ? ROLNI_(n) : 0, 1},
                                           ROLNI_SPD_BLOCKS(ROLNI_(L0), ROLNI_(n)), ROLNI_SPD_BLOCKS(ROLNI_(L1), ROLNI_(n)),
                                           ROLNI_SPD_BLOCKS(ROLNI_(L2), ROLNI_(n)), ROLNI_SPD_BLOCKS(ROLNI_(L3), ROLNI_(n)),
                                           {ROLN_EUCLIDEAN, ROLNI_(N), ROLN_INPUTS, 1}};
ROLNI_INTS ROLNI_(blocks) = sizeof ROLNI_(table) / sizeof *ROLNI_(table) ROLNI_INTS_END;

/* Random weights (scales 1, no range, input map 0). Status of roln_ae_init. */
ROLN_FN roln_status ROLNI_(init)(ROLNI_(params) *p, uint64_t *seed, ROLNI_(start) *work)
{
    roln_real *each = ROLNI_EACH(p);
    int i;
    memset(p, 0, sizeof *p);
    p->slope = ROLNI_(model).ae.slope, p->least = ROLNI_(model).lnn.least;
    p->scale.q = p->scale.t = p->scale.m = 1;
    if (each)
        for (i = 0; i < ROLNI_(N); i++)
            each[i] = 1;
    roln_lnn_init(&ROLNI_(model).lnn, p->theta + ROLNI_(ae_size), seed);
    return roln_ae_init(&ROLNI_(model).ae, p->theta, seed, work->init);
}

/* Linear optimum: scales and the POD autoencoder from the samples q, qd [count][N], random networks, with ROLN_CHART four times as
   steep as those of NAME_init (roln_lnn_steepen). qbar [N] out.
   Status of roln_fit_scale, roln_ae_init_pod; p then holds no model. */
ROLN_FN roln_status ROLNI_(init_pod)(ROLNI_(params) *p, int count, const roln_real *q, const roln_real *qd,
                                     roln_real qbar[ROLN_AT_LEAST(ROLNI_(N))], uint64_t *seed, ROLNI_(start) *work)
{
    roln_status st;
    memset(p, 0, sizeof *p);
    st = roln_fit_scale(&ROLNI_(model), count, q, qd, qbar, &p->scale, ROLNI_EACH(p));
    if (st == ROLN_OK)
        st = roln_ae_init_pod(&ROLNI_(model).ae, count, q, 1 / p->scale.q, ROLNI_EACH(p), p->theta, work->init_pod.room,
                              work->init_pod.work);
    if (st != ROLN_OK) return st;
    p->slope = ROLNI_(model).ae.slope, p->least = ROLNI_(model).lnn.least;
    roln_lnn_init(&ROLNI_(model).lnn, p->theta + ROLNI_(ae_size), seed);
    if (ROLNI_(degree) > 0) roln_lnn_steepen(&ROLNI_(model).lnn, 4, p->theta + ROLNI_(ae_size)); /* z is in [-1, 1] */
    return ROLN_OK;
}

#if ROLNI_AT(1, ROLN_CHART) > 0

/* Sums of a chart in closed form, numbers that may be merged by adding them: zero it once. */
typedef struct {
    double sums[ROLN_CHART_SUMS(ROLNI_)];
} ROLNI_(chart);

/* Add the samples q [count][N] to c (roln_chart_add), for the encoder in p. A sample that is not finite ends the call; those before
   it are added, c->sums[0] is how many there are. */
ROLN_FN roln_status ROLNI_(chart_add)(const ROLNI_(params) *p, int count, const roln_real *q, ROLNI_(chart) *c,
                                      ROLNI_(start) *work)
{
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_chart_add(&ROLNI_(model).ae, p->theta, count, q, 1 / p->scale.q, ROLNI_EACH(p), c->sums,
                          work->chart_add.room, work->chart_add.work);
}

/* Add the sums of other samples for the same encoder. */
ROLN_FN void ROLNI_(chart_merge)(const ROLNI_(chart) *from, ROLNI_(chart) *to)
{
    roln_chart_merge(ROLN_CHART_SUMS(ROLNI_), from->sums, to->sums);
}

/* The decoder of the bent layer that fits c best, with ridge |W|^2 (roln_chart_solve; ROLN_CHART_RIDGE is usual). residual [1]:
   what it leaves, in parts of the deviation of the samples from their mean. p and residual stay as they were unless ROLN_OK. */
ROLN_FN roln_status ROLNI_(chart_solve)(ROLNI_(params) *p, const ROLNI_(chart) *c, roln_real ridge, roln_real *residual,
                                        ROLNI_(start) *work)
{
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_chart_solve(&ROLNI_(model).ae, c->sums, ridge, p->theta, residual, work->chart_solve);
}

/* Coordinates in which the range in p (NAME_fit_range) is -1 .. 1, W = 0 (roln_chart_center); NAME_init_pod ends in such already. p
   stays as it was unless ROLN_OK. */
ROLN_FN roln_status ROLNI_(chart_center)(ROLNI_(params) *p)
{
    roln_status st;
    int i;
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    for (i = 0; i < ROLNI_(n); i++) {
        const roln_real half = p->z_max[i] / 2 - p->z_min[i] / 2;
        if (half > 0 && !roln_finite(p->zd_max[i] / half)) return ROLN_E_NOT_FINITE;
    }
    st = roln_chart_center(&ROLNI_(model).ae, p->z_min, p->z_max, p->theta);
    for (i = 0; i < ROLNI_(n) && st == ROLN_OK; i++) {
        p->zd_max[i] /= p->z_max[i] / 2 - p->z_min[i] / 2;
        p->z_min[i] = -1, p->z_max[i] = 1;
    }
    return st;
}

/* Steps for the encoder: zero it once. Saved and restored with the parameters they resume bit for bit; what stands behind keep is
   scratch. */
typedef struct {
    roln_lbfgs state;
    roln_real psi[ROLNI_(n) * ROLNI_(bent)], from[ROLNI_(bent)];
    roln_real keep[ROLN_LBFGS_KEEP(ROLN_TURN_PAIRS, ROLNI_(n) * ROLNI_(bent))];
    double sums[ROLN_CHART_SUMS(ROLNI_)], room[ROLN_CHART_TURN_ROOM(ROLNI_)];
    roln_real work[ROLN_CHART_TURN_WORK(ROLNI_)];
} ROLNI_(turn);

/* One step for the encoder of the bent layer, behind NAME_init_pod, on the first samples of the windows of b, a few thousand, the
   same ones in every step, until the residual [1] falls by less than a hundredth in 20 steps (roln_chart_turn). p becomes a model
   with a better encoder, coordinates that are modes of motion, and the decoder and the range that fit these samples. Then
   NAME_chart_add, NAME_chart_solve and NAME_fit_range with all samples. p and residual stay as they were unless ROLN_OK;
   ROLN_E_NO_CONVERGENCE: no step lowers the residual, which is the end (never of the first call, which then fits the start). */
ROLN_FN roln_status ROLNI_(chart_turn)(ROLNI_(params) *p, const roln_batch *b, ROLNI_(turn) *turn, roln_real *residual)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_turn t = {&turn->state, turn->psi, turn->from, turn->keep, turn->sums, turn->room};
    roln_status st;
    int i;
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    st = roln_chart_turn(&m, b, &t, p->theta, p->zd_max, residual, turn->work);
    for (i = 0; i < ROLNI_(n) && st == ROLN_OK; i++)
        p->z_min[i] = -1, p->z_max[i] = 1;
    return st;
}

#else
ROLNI_ASSERT(degree_must_be_a_number_that_the_preprocessor_can_read, ROLNI_(degree) == 0)
#endif

/* Variance of the data of each loss term (roln_variance): roln_loss_divide(&weights, &var) scales a loss by it. */
ROLN_FN roln_status ROLNI_(variance)(const ROLNI_(params) *p, const roln_batch *b, roln_loss *var, ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_variance(&m, b, var, work->variance);
}

/* scale.m of a machine whose forces are known, from samples with tau and qdd (roln_fit_inertia); before training, for it changes
   what the weights mean. p stays as it was unless ROLN_OK. */
ROLN_FN roln_status ROLNI_(fit_inertia)(ROLNI_(params) *p, const roln_batch *b, ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_fit_inertia(&m, b, &p->scale.m, work->fit_inertia);
}

/* Add the gradient of the acceleration loss over single samples (b->steps = 0, b->qdd given). */
ROLN_FN roln_status ROLNI_(grad_acc)(const ROLNI_(params) *p, const roln_loss *weights, const roln_batch *b, ROLNI_(gradient) *g,
                                     ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_gradient rest = roln_gradient_of(&ROLNI_(model), g->rest.theta, &g->rest.loss, &g->rest.windows);
    roln_gradient to = roln_gradient_of(&ROLNI_(model), g->theta, &g->loss, &g->windows);
    to.rest = &rest;
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_grad_acc(&m, weights, b, ROLN_BLOCK, &to, work->grad_acc);
}

/* Add the gradient of the ODE loss over windows of b->steps <= ROLN_HORIZON steps of dt seconds (roln_grad). With
   b->steps = 0 and weights for q, qd only, it trains the autoencoder alone. ROLN_E_LENGTH: the windows are longer, or without
   b->qd (variational loss) shorter than 2 steps. */
ROLN_FN roln_status ROLNI_(grad)(const ROLNI_(params) *p, const roln_loss *weights, const roln_batch *b, roln_real dt,
                                 ROLNI_(gradient) *g, ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    const roln_gradient rest = roln_gradient_of(&ROLNI_(model), g->rest.theta, &g->rest.loss, &g->rest.windows);
    roln_gradient to = roln_gradient_of(&ROLNI_(model), g->theta, &g->loss, &g->windows);
    to.rest = &rest;
    if (b->steps > ROLN_HORIZON) return ROLN_E_LENGTH;
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_grad(&m, weights, b, dt, ROLN_BLOCK, &to, work->grad);
}

/* One step of Riemannian Adam with the mean of the gradients in g. p, o stay as they were unless ROLN_OK. ROLN_E_NOT_FINITE: the
   gradient is not, or holds no window, or a setting is not or is negative; status of the retractions (roln_adam_update). */
ROLN_FN roln_status ROLNI_(update)(ROLNI_(params) *p, const roln_opt *opt, ROLNI_(optimiser) *o, const ROLNI_(gradient) *g,
                                   ROLNI_(train) *work)
{
    const roln_moments moments = {o->m, o->v, o->v_max};
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_adam_update(ROLNI_(blocks), ROLNI_(table), opt, 1 / g->windows, g->theta, p->theta, &o->adam, &moments,
                            work->update);
}

#if ROLN_ROWS > 0
/* At most ROLN_ROWS residuals r, and the rows J of their derivatives by what ROLN_LEARN names, with room for one more. weight: by
   which large ones are scaled down; expect, next: the residuals that are expected where a step ends, and those that are there. The
   signs of row k are drawn from seed + k. */
typedef struct {
    uint64_t seed;
    roln_real r[ROLN_ROWS], weight[ROLN_ROWS], expect[ROLN_ROWS], next[ROLN_ROWS], J[(ROLN_ROWS + 1) * ROLNI_(newton_size)];
} ROLNI_(residuals);

/* Gauss-Newton from step to step. Zero it once, and set state to ROLN_NEWTON_START. With the parameters it resumes bit for bit. */
typedef struct {
    roln_newton state;
    ROLNI_(params) next; /* where the step ends */
    roln_real carried[ROLNI_(newton_size)]; /* what earlier rows still ask for, or the last step (roln_newton_rows) */
    roln_real keep[ROLNI_(newton_size)], S[ROLNI_(newton_side) * (ROLNI_(newton_side) + 1)];
    union {
        roln_real rows[ROLN_MAX(1, ROLNI_VERB_WORK(ROLNI_))], sums[ROLN_SYM_WORK];
        roln_real step[ROLN_NEWTON_STEP_WORK(ROLN_ROWS, ROLNI_(newton_size), ROLNI_VERB_WORK(ROLNI_))];
    } work;
} ROLNI_(newton);

/* The blocks that it moves: those behind the autoencoder are the last 11. */
ROLNI_INTS
    ROLNI_(newton_from) = ROLNI_LEARN(ROLN_LEARN) ? ROLNI_(ae_size) : 0,
    ROLNI_(newton_first) = ROLNI_LEARN(ROLN_LEARN) ? ROLNI_(blocks) - 11 : 0,
    ROLNI_(newton_blocks) = ROLNI_(blocks) - ROLNI_(newton_first)
ROLNI_INTS_END;

/* Rows at .. at + b->count - 1 of g at p, of the acceleration loss if b has qdd and no steps, else of windows (roln_rows). again:
   the residuals alone, to g->next, p being o->next. ROLN_E_LENGTH: they do not fit into g, the windows are longer than
   ROLN_HORIZON, or as NAME_grad. Threads may fill different rows at the same time, each with work of its own. */
ROLN_FN roln_status ROLNI_(rows)(const ROLNI_(params) *p, const roln_loss *weights, const roln_batch *b, roln_real dt, int at,
                                 int again, ROLNI_(residuals) *g, ROLNI_(train) *work)
{
    const roln_trained m = ROLNI_(trained)(p);
    roln_real *scratch = b->qdd && b->steps == 0 ? work->grad_acc : work->grad;
    roln_rows_to to;
    if (b->steps > ROLN_HORIZON || at < 0 || b->count < 0 || at > ROLN_ROWS - b->count) return ROLN_E_LENGTH;
    to.J = again ? NULL : g->J + ROLNI_AS(size_t, at) * ROLNI_(newton_size);
    to.r = (again ? g->next : g->r) + at;
    to.behind = ROLNI_LEARN(ROLN_LEARN), to.seed = g->seed + ROLNI_AS(uint64_t, at);
    if (ROLNI_(foreign)(p)) return ROLN_E_SHAPE;
    return roln_rows(&m, weights, b, dt, &to, scratch);
}

/* count rows are complete: they and what is carried from earlier ones become tangents at p (roln_newton_rows). ROLN_E_LENGTH:
   count. Of the system in the rows, NAME_newton_size > 8 count, count must not change from step to step. */
ROLN_FN roln_status ROLNI_(newton_rows)(const ROLNI_(params) *p, const roln_newton_opt *opt, int count, ROLNI_(residuals) *g,
                                        ROLNI_(newton) *o)
{
    if (count < 1 || count > ROLN_ROWS) return ROLN_E_LENGTH;
    rolni_copy(ROLNI_(newton_size), o->carried, g->J + ROLNI_AS(size_t, count) * ROLNI_(newton_size));
    return roln_newton_rows(ROLNI_(newton_blocks), ROLNI_(table) + ROLNI_(newton_first), opt, count,
                            p->theta + ROLNI_(newton_from), g->J, g->r, g->weight, &o->state, o->work.rows);
}

/* Their sums, rows from .. to - 1 of the system: 0, NAME_newton_side for all, unless two threads share them. */
ROLN_FN void ROLNI_(newton_sums)(const roln_newton_opt *opt, int count, int from, int to, const ROLNI_(residuals) *g,
                                 ROLNI_(newton) *o, roln_real work[ROLN_AT_LEAST(ROLN_SYM_WORK)])
{
    roln_newton_sums(opt, count, ROLNI_(newton_size), from, to, g->J, o->S, work);
}

/* A step from p to o->next, with g->expect (roln_newton_step). */
ROLN_FN roln_status ROLNI_(newton_step)(const ROLNI_(params) *p, const roln_newton_opt *opt, int count, ROLNI_(residuals) *g,
                                        ROLNI_(newton) *o)
{
    roln_newton_system system;
    system.R = count, system.P = ROLNI_(newton_size), system.J = g->J, system.r = g->r, system.S = o->S;
    if (count < 1 || count > ROLN_ROWS) return ROLN_E_LENGTH;
    memcpy(&o->next, p, sizeof *p);
    return roln_newton_step(ROLNI_(newton_blocks), ROLNI_(table) + ROLNI_(newton_first), opt, &system,
                            p->theta + ROLNI_(newton_from), &o->state, o->next.theta + ROLNI_(newton_from), g->expect, o->keep,
                            o->work.step);
}

/* Nonzero if the step is taken: then p becomes o->next. It is judged by the first `judges` of its count rows, of which g->next has
   the residuals at o->next: NAME_rows with again = 1, whatever its status. */
ROLN_FN int ROLNI_(newton_judge)(ROLNI_(params) *p, int count, int judges, ROLNI_(residuals) *g, ROLNI_(newton) *o)
{
    if (count < 1 || count > ROLN_ROWS || judges < 1 || judges > count) return 0;
    if (!roln_newton_judge(judges, g->r, g->weight, g->expect, g->next, &o->state)) {
        if (ROLN_NEWTON_SIDE(count, ROLNI_(newton_size)) < ROLNI_(newton_size)) {
            rolni_zero(ROLNI_(newton_size), o->carried);
            rolni_zero(ROLNI_(newton_size), g->J + ROLNI_AS(size_t, count) * ROLNI_(newton_size));
        }
        return 0;
    }
    memcpy(p, &o->next, sizeof *p);
    rolni_copy(ROLNI_(newton_size), o->keep, o->carried);
    return 1;
}
#else
ROLNI_ASSERT(rows_must_be_a_number_that_the_preprocessor_can_read, (ROLN_ROWS) <= 0)
#endif

#else

typedef union { uint32_t words[sizeof(ROLNI_(params)) / 4]; ROLNI_(params) params; } ROLNI_(words); /* what NAME_write writes */

/* Scratch of NAME_store: the numbers of the full model, and behind them that of roln_store. */
typedef struct {
    roln_real full[ROLN_NUMBERS(ROLNI_(own) * ROLNI_(N), ROLNI_(n), ROLNI_(full_size))];
    roln_real store[ROLN_MAX(1, ROLN_AE_STORE_WORK(ROLNI_))];
} ROLNI_(start);

/* Parameters from the count bytes that NAME_pack of the same model with ROLN_STORE full wrote, after NAME_fit_range. Status of
   roln_unpack, roln_store (ROLN_E_RANGE without a range z_min[i] < z_max[i] for all i); p is written only on ROLN_OK. */
ROLN_FN roln_status ROLNI_(store)(int count, const unsigned char *bytes, ROLNI_(params) *p, ROLNI_(start) *work)
{
    enum { ROLNI_n = ROLNI_(n), ROLNI_own = ROLNI_(own) * ROLNI_(N) };
    const roln_real *x = work->full, *range = x + 6 + ROLNI_own;
    roln_model full = ROLNI_(model);
    const roln_trained from = {&full, NULL, range, range + ROLNI_n, range + 2 * ROLNI_n, range + 3 * ROLNI_n, x + 5};
    roln_status st;
    full.ae.storage = ROLN_FULL;
    st = roln_unpack(&full, count, bytes, work->full);
    if (st == ROLN_OK) st = roln_store(&ROLNI_(model), &from, p->theta, work->store);
    if (st != ROLN_OK) return st;
    p->slope = x[0], p->least = x[1], p->scale.q = x[2], p->scale.t = x[3], p->scale.m = x[4];
    p->dt = range[-1];
    if (ROLNI_own > 0) rolni_copy(ROLNI_own, x + 5, ROLNI_EACH(p));
    rolni_copy(ROLNI_n, from.z_min, p->z_min);
    rolni_copy(ROLNI_n, from.z_max, p->z_max);
    rolni_copy(ROLNI_n, from.zd_max, p->zd_max);
    return ROLN_OK;
}

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
#undef ROLN_STEP
#undef ROLN_SLOPE
#undef ROLN_CHART
#undef ROLN_BASE
#undef ROLN_MASS
#undef ROLN_LAYERS
#undef ROLN_LEAST
#undef ROLN_DAMPING
#undef ROLN_FRICTION
#undef ROLN_ANGLES
#undef ROLN_SCALE
#undef ROLNI_EACH
#undef ROLN_INPUTS
#undef ROLN_HORIZON
#undef ROLN_BLOCK
#undef ROLN_STORE
#undef ROLN_ROWS
#undef ROLN_LEARN
#undef ROLN_LOAD
#undef ROLNI_LOAD_OF
#undef ROLN_PLAN

#endif /* ROLN_NAME */
