/* SPDX-License-Identifier: MIT */
/* fitted.h - OUT_limits.h: what the recordings say of doubt, limits of a guard, noise of a filter and gains of an observer, fitted
   to held-out recordings, as initialisers in C and C++.

   train.c includes it behind report.h.

       fit_settings      NAME_evidence_add on the recordings that were trained with; NAME_fit_doubt, NAME_fit_outlook,
                         NAME_fit_limits, NAME_fit_noise and NAME_fit_observer on windows of held-out recordings
       write_settings    OUT_limits.h, to be included behind the config header: NAME_known, NAME_limits, NAME_noise,
                         NAME_steady_gains

   Limits of torque are the largest torques of all recordings, and the largest changes of them between two samples. The other
   limits are SLACK times the largest need of windows that are spread over the held-out recordings; that of novelty also of the
   recordings that were trained with, by the evidence of others. A filter of the recordings (filter=, smooth=, smoother=) removes
   the noise that the encoders of a controller have, so it is added to q again: white noise as large as the spectrum shows it. tick=
   carries all of it to a controller of another tick than the step of the recordings. */

#ifndef FITTED_H
#define FITTED_H

#define LEFT_OUT_COST 2e9 /* a second or two; with seconds= below 50 in proportion less */

enum { SLACK = 4, WINDOW_TICKS = 64, GUARD_TICKS = 8000, FILTER_TICKS = 2000, KNOWN = 50000, LEFT_OUT = 8,
       DOUBTED = 4000, AHEAD = 200, OUTLOOKS = 200, RESIDUAL_TICKS = 8 /* of residual_window */ };

static struct {
    roln_limits limits;
    roln_noise noise;
    roln_real tau[M(force_size)], rate[M(force_size)], q[M(N)], unknown[M(N)];
    M(observer_gains) gains;
    M(evidence) evidence;
    const char *no_evidence, *no_limits, *no_noise, *no_gains, *no_outlook; /* why there are none; NULL: there are */
    int outlooks, limit_ticks, noise_ticks, noisy; /* noisy: noise was added to q again */
} found;

/* Windows that cover held-out recordings, or some of each, of that many steps, or fewer in short recordings; of all their steps
   as many as `most` windows of full length have. */
static roln_batch held_windows_of(int steps, int stride, int *start, int most)
{
    roln_batch b = {.stride = stride, .start = start, .q = d.q, .qd = d.qd, .steps = steps};
    double count;
    int k;
    b.tau = acts() ? d.tau : NULL;
    while ((b.count = windows(&d, train, d.trajectories, b.steps * stride, b.steps * stride, 0, start)) == 0 && b.steps > 1)
        b.steps /= 2;
    count = fmin(b.count, (double)most * steps / b.steps);
    for (k = 0; k < (int)count; k++)
        start[k] = start[(int)(k * (b.count / count))];
    b.count = (int)count;
    return b;
}

static roln_batch held_windows(int *start, int most)
{
    return held_windows_of(WINDOW_TICKS, 1, start, most);
}

/* What the numbers are fitted to. */
static const char *held_text(void)
{
    return strcmp(words[HELD].value, "none") == 0 ? "recordings that were trained with (held=none)" : "held-out recordings";
}

/* Held-out windows for the limits. With false_alarms= there are so many that the residual of four is beyond its limit, if the
   recordings have as many. */
static roln_batch guard_windows(int *start)
{
    const double rate = set("false_alarms");
    const int each = held_windows(start, d.samples).steps / RESIDUAL_TICKS;
    const double most = rate > 0 && each > 0 ? fmin(4 / (rate * each), d.samples) : 0;
    return held_windows(start, (int)fmax(GUARD_TICKS / WINDOW_TICKS, most));
}

/* Refuses a false_alarms= of less than one window of the held-out recordings. */
static void check_false_alarms(void)
{
    const double rate = set("false_alarms");
    int *start, windows;
    roln_batch b;
    if (!(rate > 0)) return;
    if ((int)M(driven) > 0)
        fail("false_alarms=%g: there is no residual with ROLN_DRIVEN, for the power of the drives is unknown\n"
             "hint: leave false_alarms= out", rate);
    start = room((size_t)d.samples + 1, sizeof *start);
    b = guard_windows(start), windows = b.count * (b.steps / RESIDUAL_TICKS);
    free(start);
    if (rate * (windows + 1) < 1)
        fail("false_alarms=%g: %.0f windows of %d samples are needed, held-out recordings have %d\nhint: %s", rate,
             ceil(1 / rate) - 1, RESIDUAL_TICKS, windows, "a larger false_alarms=, a larger held=, or longer recordings");
}

/* As many windows, most / 8 .. most, as there is time for, of which `each` is that of one. */
static int affordable(double each, int most)
{
    return (int)fmin(most, fmax(most / 8 + 1, 0.1 * left() / fmax(each, 1e-9)));
}

/* Every so many samples of the recordings that are trained with, counted through all of them, but for every LEFT_OUT-th recording
   from number `out` on; -1: none is left out. Returns how many. */
static int known_samples(int every, int out, int *start)
{
    int count = 0, k, i;
    for (k = 0; k < train; k++)
        for (i = d.first[k]; i < d.first[k + 1]; i++)
            if (i % every == 0 && (out < 0 || k % LEFT_OUT != out)) start[count++] = i;
    return count;
}

/* States of the recordings that were trained with; errors of held-out windows of 25 ms, and of half a second in steps of 2.5 ms: an
   error of the integrator is not one of the model. */
static const char *fit_evidence(int *start)
{
    const int short_steps = (int)fmax(1, 0.025 / d.dt + 0.5), stride = (int)fmax(1, 0.0025 / d.dt + 0.5);
    roln_batch b = {.stride = 1, .start = start, .q = d.q, .qd = d.qd, .steps = 0};
    double each = 0;
    roln_status st;
    int k;
    b.count = known_samples(1 + d.samples / KNOWN, -1, start);
    st = M(evidence_add)(&s.p, &b, &found.evidence, &work[0].evidence_add);
    if (st == ROLN_OK) {
        b = held_windows_of(short_steps, 1, start, DOUBTED);
        st = M(fit_doubt)(&s.p, &b, (roln_real)d.dt, &found.evidence, &work[0].fit_doubt);
    }
    for (k = 0; k < 2 && st == ROLN_OK; k++) { /* the first window tells how long one takes */
        const double from = now();
        roln_status ahead;
        b = held_windows_of(AHEAD, stride, start, k ? affordable(each, OUTLOOKS) : 1);
        ahead = M(fit_outlook)(&s.p, &b, (roln_real)(d.dt * stride), &found.evidence, &work[0].fit_outlook);
        found.no_outlook = ahead == ROLN_OK ? NULL : roln_status_text(ahead), found.outlooks = b.count;
        if (ahead != ROLN_OK) found.evidence.lasts = 0;
        each = now() - from;
    }
    return st == ROLN_OK ? NULL : roln_status_text(st);
}

/* The largest torque of a motor as it was read, in the unit of the recordings; 0: none was, or an acceleration is in its place. */
static roln_real recorded_torque(int j)
{
    int c;
    for (c = 0; c < d.count; c++) {
        const field *f = &d.fields[c];
        if (f->kind != OF_TAU || f->index != j) continue;
        return (int)M(driven) > 0 && j >= (int)M(N) - (int)M(driven) ? 0 : (roln_real)f->most * (roln_real)unit_of_tau(&d);
    }
    return 0;
}

/* Largest torques and largest changes of them, of all recordings. A filter, new times and a delay may overshoot: then the largest
   that was recorded counts. */
static void fit_torques(void)
{
    enum { F = M(force_size) };
    int k, i, j;
    for (k = 0; k < d.trajectories; k++)
        for (i = d.first[k]; i < d.first[k + 1]; i++)
            for (j = 0; j < F; j++) {
                const roln_real tau = d.tau[i * F + j], change = i > d.first[k] ? tau - d.tau[(i - 1) * F + j] : 0;
                found.tau[j] = ROLN_MAX(found.tau[j], ROLN_ABS(tau));
                found.rate[j] = ROLN_MAX(found.rate[j], ROLN_ABS(change) / found.limits.dt);
            }
    for (j = 0; j < F; j++) {
        if (recorded_torque(j) > 0) found.tau[j] = ROLN_MIN(found.tau[j], recorded_torque(j));
        found.rate[j] += 4 * ROLN_EPS * found.tau[j] / found.limits.dt; /* what rounds when torques are clipped */
        found.tau[j] += 4 * ROLN_EPS * found.tau[j];                    /* and here in the unit of the recordings */
        found.limits.tau = ROLN_MAX(found.limits.tau, found.tau[j]);
        found.limits.rate = ROLN_MAX(found.limits.rate, found.rate[j]);
    }
}

/* The largest novelty of states in recordings that were trained with, by the evidence of those that remain when an eighth of the
   recordings is left out. A recording is no witness of its own. States are so few that it takes LEFT_OUT_COST multiply-adds. */
static roln_real novelty_left_out(int *start)
{
    static M(evidence) others;
    const double size = (int)M(terms), cost = LEFT_OUT_COST * (set("seconds") > 0 ? fmin(1, set("seconds") / 50) : 1);
    const double all = size * size * d.samples / cost, known = 2 * LEFT_OUT * all, seen = fmax(d.samples / KNOWN, all);
    roln_batch b = {.stride = 1, .start = start, .q = d.q, .qd = d.qd, .steps = 0};
    roln_real most = 0;
    int part, k, i;
    for (part = 0; part < LEFT_OUT && train > 1; part++) {
        memset(&others, 0, sizeof others);
        b.count = known_samples(1 + (int)known, part, start);
        (void)M(evidence_add)(&s.p, &b, &others, &work[0].evidence_add); /* as of all recordings at once */
        for (k = part; k < train; k += LEFT_OUT)
            for (i = d.first[k]; i < d.first[k + 1]; i += 1 + (int)seen) {
                static M(work) w;
                M(state) x;
                M(latent) z;
                M(doubts) doubts;
                memcpy(x.q, d.q + i * (int)M(N), sizeof x.q), memcpy(x.qd, d.qd + i * (int)M(N), sizeof x.qd);
                if (M(encode)(&s.p, &x, &z, &w.encode) != ROLN_OK) continue;
                if (M(doubt)(&s.p, &others, &z, &doubts, &w.doubt) == ROLN_OK) most = ROLN_MAX(most, doubts.novelty);
            }
    }
    return most;
}

static const char *fit_limits(int *start)
{
    static const roln_real B[M(N)];
    static const roln_motors elsewhere = {.count = 1, .B = B}; /* limits of torque are not those of the windows */
    const roln_batch b = guard_windows(start);
    roln_limits *l = &found.limits;
    roln_status st;
    l->false_alarms = (roln_real)set("false_alarms");
    l->hold = l->false_alarms > 0 ? 3 : 5; /* alarms raise the limit by e^(hold/8) before the guard expires */
    l->dt = (roln_real)d.dt, l->residual_window = RESIDUAL_TICKS, l->tau = 1;
    if (!found.no_evidence) l->evidence = found.evidence.L;
    l->motors = &elsewhere;
    st = M(fit_limits)(&s.p, &b, SLACK, l, found.tau, found.rate, &work[0].fit_limits);
    l->motors = NULL;
    if (st != ROLN_OK) return roln_status_text(st);
    found.limit_ticks = b.count * (b.steps + 1);
    if (l->evidence) l->novelty = ROLN_MAX(l->novelty, SLACK * novelty_left_out(start));
    if ((int)M(n) == (int)M(N)) l->q_tolerance = l->qd_tolerance = 0; /* z is all of q */
    l->tau = l->rate = 0, l->tau_each = l->rate_each = NULL;
    if (!b.tau) return NULL;
    l->tau_each = found.tau, l->rate_each = found.rate;
    fit_torques();
    return NULL;
}

/* q of held-out recordings as encoders give it. */
static roln_real *measured_q(void)
{
    const size_t N = M(N), from = (size_t)d.first[train] * N, count = (size_t)d.samples * N;
    roln_real *q = room(count + 1, sizeof *q);
    uint64_t seed = 1;
    double noise[M(N)] = {0};
    size_t i;
    int c;
    for (c = 0; c < d.count && (d.reach > 0 || set("smooth") > 0 || words[SMOOTHER].value); c++)
        if (d.fields[c].kind == OF_Q && d.fields[c].noise > 0) noise[d.fields[c].index] = d.fields[c].noise, found.noisy = 1;
    for (i = from; i < count; i++)
        q[i] = d.q[i] + (roln_real)noise[i % N] * roln_normal(&seed);
    return q;
}

/* What the model leaves of the torque of each joint, held out, to x [N]. Returns x, or NULL if that is not known. */
static roln_real *left_of_torques(roln_real *x)
{
    int j;
    for (j = 0; j < (int)M(N); j++) {
        if (!JOINTS || held_torques.samples == 0 || !(held_torques.off[j] > 0)) return NULL;
        x[j] = (roln_real)sqrt(held_torques.off[j] / held_torques.samples);
    }
    return x;
}

static const char *fit_noise(int *start, roln_real *q)
{
    roln_status st = ROLN_OK;
    double each = 0;
    int k;
    for (k = 0; k < 2; k++) { /* the first window tells how long one takes */
        const roln_noise begin = {.dt = (roln_real)d.dt, .gate = 6, .lost = 5};
        const double from = now();
        roln_batch b = held_windows(start, k ? affordable(each, FILTER_TICKS / WINDOW_TICKS) : 1);
        found.noise = begin, b.q = q;
        st = M(fit_noise)(&s.p, &b, &found.noise, found.q, left_of_torques(found.unknown), &work[0].fit_noise);
        found.noise_ticks = b.count * (b.steps + 1), each = now() - from;
    }
    return st == ROLN_OK ? NULL : roln_status_text(st);
}

/* The tick of the controller, tick=, in place of the step of the recordings. A torque that the model does not know is drawn anew
   every tick. In a second 1 / dt of them move a velocity by as much as dt^(1/2) times one, so one of a shorter tick is larger. */
static void carry_to_tick(void)
{
    const double tick = set("tick"), ticks = tick > 0 ? d.dt / tick : 1;
    const roln_real larger = (roln_real)sqrt(ticks);
    int j;
    found.limits.dt = found.noise.dt = (roln_real)(d.dt / ticks);
    found.limits.residual_window = (int)fmin(fmax(1, found.limits.residual_window * ticks + 0.5), 1e6); /* as long in s */
    found.noise.tau *= larger;
    for (j = 0; j < (int)M(N); j++)
        found.unknown[j] *= larger;
}

static const char *fit_observer(int *start, roln_real *q)
{
    roln_batch b = held_windows(start, GUARD_TICKS / WINDOW_TICKS);
    roln_status st;
    if (found.no_noise) return "there is no noise";
    b.q = q;
    st = M(fit_observer)(&s.p, &found.noise, &b, &found.gains, &work[0].fit_observer);
    return st == ROLN_OK ? NULL : roln_status_text(st);
}

/* Limits, noise and gains of the weights, or why there are none. */
static void fit_settings(void)
{
    int *start = room((size_t)d.samples + 1, sizeof *start);
    roln_real *q;
    memset(&found, 0, sizeof found);
    q = measured_q();
    found.no_evidence = fit_evidence(start);
    found.no_limits = fit_limits(start), found.no_noise = fit_noise(start, q);
    carry_to_tick();
    found.no_gains = fit_observer(start, q);
    free(start), free(q);
}

/* A number as a constant of type roln_real in C and C++, of as few digits as tell it. */
typedef struct {
    char text[48];
} constant;

static constant constant_of(roln_real x)
{
    constant c;
    char digits[32];
    int count = 1;
    do
        snprintf(digits, sizeof digits, "%.*g", count, (double)x);
    while ((roln_real)strtod(digits, NULL) != x && count++ < 17);
    snprintf(c.text, sizeof c.text, "ROLN_C(%s%s)", digits, strpbrk(digits, ".e") ? "" : ".0");
    return c;
}

/* What is said of each number of an array. */
static const char *said_of_torque(int j)
{
    if (!(found.tau[j] > 0)) return "no torque was recorded";
    if ((double)found.tau[j] < 0.999 * (double)recorded_torque(j))
        return "the largest behind filter, means and delay; more was recorded, which may be noise";
    return words[SPREAD].value ? "the largest that was recorded, without those of spread=, which may be less than the motor can"
                               : "the largest that was recorded, which may be less than the motor can";
}

static const char *said_of_rate(int j)
{
    const int changed = d.kernel > 0 || delay_found != 0 || (d.reach > 0 && !(set("smooth") > 0)); /* smooth= changes q alone */
    if (!(found.rate[j] > 0)) return "no torque was recorded";
    return changed ? "the largest change from sample to sample, behind filter, new times and delay"
                   : "the largest change from sample to sample that was recorded";
}

static const char *said_of_noise(int j)
{
    double most = 0;
    int i;
    for (i = d.first[train]; i < d.samples; i++)
        most = fmax(most, fabs((double)d.q[i * (int)M(N) + j]));
    if ((double)found.q[j] < 8 * (double)ROLN_EPS * most)
        return "UNKNOWN, the recordings have no noise; at least the step of your encoder over the root of 12";
    return found.noisy ? "the noise that the spectrum shows, and what the model leaves of q"
                       : "noise of the recordings, and what the model leaves of q";
}

static const char *said_of_unknown(int j)
{
    (void)j;
    return "torque that the model does not know, in proportion to what it leaves of that joint's torque";
}

/* An array of a number for each joint or motor; `said` is told of each of them behind its unit. */
static void put_array(FILE *f, const char *name, const char *size, int count, const roln_real *x, int kind, const char *per,
                      const char *(*said)(int j))
{
    int j;
    fprintf(f, "static const roln_real " STRING(MODEL) "_%s[" STRING(MODEL) "_%s] = {\n", name, size);
    for (j = 0; j < count; j++)
        fprintf(f, "    %s, /* %s %d, unit %s%s: %s */\n", constant_of(x[j]).text, kind == OF_Q ? "joint" : "motor", j + 1,
                unit_of_column(kind, j), per, said(j));
    fprintf(f, "};\n");
}

/* One number of an initialiser and what it is. */
static void put_constant(FILE *f, roln_real x, const char *format, ...)
{
    va_list list;
    fprintf(f, "    %s, /* ", constant_of(x).text);
    va_start(list, format);
    vfprintf(f, format, list);
    va_end(list);
    fprintf(f, " */\n");
}

/* The tick that the numbers are for. */
static void put_tick(FILE *f, roln_real dt)
{
    put_constant(f, dt, "dt, s: %s",
                 set("tick") > 0 ? "the tick of your controller"
                                 : "the step of the recordings; for another tick write this file again: --resume steps=1 tick=");
}

/* The unit of a power. */
static const char *power_unit(void)
{
    if (!(set("torque") > 0)) return "energy of the model per s";
    return strcmp(unit_of_column(OF_TAU, 0), "Nm") == 0 ? "W" : "unit of tau times that of qd";
}

static void put_limits(FILE *f)
{
    const roln_limits *l = &found.limits;
    const int torques_are = l->tau_each != NULL, smooth_are = d.reach > 0 || words[SMOOTHER].value;
    fprintf(f, "\n/* Limits of NAME_tick, from %d ticks of %s%s. */\n", found.limit_ticks, held_text(),
            smooth_are
                ? ", which are smooth: a controller changes torques faster, and its residual is larger"
                : "");
    if (found.no_limits) {
        fprintf(f, "/* There are none: %s */\n", found.no_limits);
        return;
    }
    if (torques_are) {
        put_array(f, "limits_tau", "force_size", M(force_size), found.tau, OF_TAU, "", said_of_torque);
        put_array(f, "limits_rate", "force_size", M(force_size), found.rate, OF_TAU, " per s", said_of_rate);
    }
    fprintf(f, "static const roln_limits " STRING(MODEL) "_limits = {\n");
    put_tick(f, l->dt);
    put_constant(f, l->margin, "margin, part of the range of z, zd: %d times what was needed, 0.1 at least", SLACK);
    put_constant(f, l->residual,
                 !(l->false_alarms > 0) ? "residual, %s: %d times the largest of the recordings"
                 : smooth_are ? "residual, %s: the part false_alarms of smooth recordings is beyond it; UNKNOWN in your loop, "
                                "so fit it there: NAME_fit_limits"
                              : "residual, %s: the part false_alarms of the recordings is beyond it",
                 power_unit(), SLACK);
    put_constant(f, l->tau,
                 torques_are ? "tau, %s: not used, for tau_each is"
                             : "tau: UNKNOWN, no torque was trained with; 0 lets no "
                               "torque pass, so write what the motors may do",
                 unit_of_column(OF_TAU, 0));
    fprintf(f, "    %d, /* hold, %s: a usual number, not fitted */\n", l->hold, l->false_alarms > 0 ? "ticks or alarms" : "ticks");
    put_constant(f, l->q_tolerance,
                 l->q_tolerance > 0 ? "q_tolerance, unit of q: %d times the largest |q - phi(z)|"
                                    : "q_tolerance: no check, z is all of q",
                 SLACK);
    put_constant(f, l->qd_tolerance,
                 l->qd_tolerance > 0 ? "qd_tolerance, unit of qd: %d times the largest |qd - J zd|"
                                     : "qd_tolerance: no check, zd is all of qd",
                 SLACK);
    fprintf(f, "    %d, /* residual_window, ticks: a usual number, not fitted */\n", l->residual_window);
    fprintf(f, "    0, /* strict: torques beyond a limit are clipped */\n");
    put_constant(f, l->rate, torques_are ? "rate, %s per s: not used, for rate_each is" : "rate: no bound",
                 unit_of_column(OF_TAU, 0));
    fprintf(f, torques_are
                   ? "    " STRING(MODEL) "_limits_tau, /* tau_each */\n    " STRING(MODEL) "_limits_rate, /* rate_each */\n"
                   : "    0, /* tau_each: none */\n    0, /* rate_each: none */\n");
    fprintf(f, "    0, /* safe: no torque once the guard has expired; an array of yours holds an arm up */\n"
               "    0, /* motors: at each joint, or the learned inputs */\n");
    fprintf(f, l->evidence ? "    " STRING(MODEL) "_known.L, /* evidence: the states that were trained with */\n"
                           : "    0, /* evidence: none, novelty is not checked */\n");
    put_constant(f, l->novelty,
                 !l->evidence ? "novelty: not checked"
                 : train > 1  ? "novelty: %d times the largest of recordings that were left out"
                              : "novelty: %d times the largest of this one recording; fit it in your loop: NAME_fit_limits",
                 SLACK);
    put_constant(f, l->false_alarms, l->false_alarms > 0 ? "false_alarms, part of the windows of good motion: as asked for"
                                                         : "false_alarms: none, residual is a fixed limit");
    fprintf(f, "};\n");
}

static void put_noise(FILE *f)
{
    const roln_noise *l = &found.noise;
    fprintf(f, "\n/* Noise of NAME_filter_tick, from %d ticks of %s. */\n", found.noise_ticks, held_text());
    if (found.no_noise) {
        fprintf(f, "/* There is none: %s */\n", found.no_noise);
        return;
    }
    put_array(f, "noise_q", "N", M(N), found.q, OF_Q, "", said_of_noise);
    if (l->tau_each) put_array(f, "noise_tau", "N", M(N), found.unknown, OF_TAU, "", said_of_unknown);
    fprintf(f, "static const roln_noise " STRING(MODEL) "_noise = {\n");
    put_tick(f, l->dt);
    put_constant(f, found.q[0], "q, %s: not used, for q_each is", unit_of_column(OF_Q, 0));
    put_constant(f, l->tau_each ? l->tau_each[0] : l->tau, l->tau_each ? "tau, %s: not used, for tau_each is"
                                                                       : "tau, %s: torque that the model does not know",
                 set("torque") > 0 ? unit_of_column(OF_TAU, 0) : "unit of the model");
    put_constant(f, l->gate, "gate, deviations: a usual number, not fitted");
    fprintf(f, "    %d, /* lost, ticks: a usual number, not fitted */\n", l->lost);
    fprintf(f, "    " STRING(MODEL) "_noise_q, /* q_each */\n");
    fprintf(f, l->tau_each ? "    " STRING(MODEL) "_noise_tau, /* tau_each */\n" : "    0, /* tau_each: none */\n");
    put_constant(f, 0, "load: no load is estimated");
    fprintf(f, "};\n");
}

/* Numbers of an initialiser, in braces. */
static void put_numbers(FILE *f, int count, const roln_real *x, const char *behind)
{
    int i;
    for (i = 0; i < count; i++)
        fprintf(f, "%s%s", i == 0 ? "{" : i % 8 ? ", " : ",\n     ", constant_of(x[i]).text);
    fprintf(f, "}%s", behind);
}

static void put_evidence(FILE *f)
{
    const M(evidence) *e = &found.evidence;
    fprintf(f, "\n/* What NAME_doubt knows: states that were trained with%s, and deviations of %s. */\n",
            words[SPREAD].value ? ", without those of spread=" : "", held_text());
    if (found.no_evidence) {
        fprintf(f, "/* There is nothing: %s */\n", found.no_evidence);
        return;
    }
    fprintf(f, "static const " STRING(MODEL) "_evidence " STRING(MODEL) "_known = {\n");
    put_constant(f, e->count, "count, states");
    fprintf(f, "    /* L: rows of a lower triangle */\n    ");
    put_numbers(f, ROLN_TRI((int)M(terms)), e->L, ",\n");
    fprintf(f,
            "    %d, /* halves */\n    /* always, grows, of zdd and of forces on z: the deviation is\n"
            "       (always^2 + grows^2 novelty^(halves / 2))^(1/2) */\n    ",
            e->halves);
    put_numbers(f, 2 * (int)M(n), e->always, ",\n    ");
    put_numbers(f, 2 * (int)M(n), e->grows, ",\n");
    if (found.no_outlook)
        put_constant(f, e->lasts, "lasts, s: NOT FITTED, so NAME_doubt_ahead and NAME_plan_tighten say ROLN_E_RANGE: %s",
                     found.no_outlook);
    else put_constant(f, e->lasts, "lasts, s: errors of the acceleration stay alike so long, by %d windows", found.outlooks);
    fprintf(f, "};\n");
}

static void put_gains(FILE *f)
{
    const M(observer_gains) *g = &found.gains;
    int c;
    fprintf(f, "\n/* Gains of NAME_observer_tick: what the filter under the noise above settles at. */\n");
    if (found.no_gains) {
        fprintf(f, "/* There are none: %s */\n", found.no_gains);
        return;
    }
    fprintf(f, "static const " STRING(MODEL) "_observer_gains " STRING(MODEL) "_steady_gains = {\n");
    put_tick(f, g->dt);
    put_constant(f, g->gate, "gate, deviations: a usual number, not fitted");
    fprintf(f, "    %d, /* lost, ticks: a usual number, not fitted */\n", g->lost);
    fprintf(f, "    /* deviations of joints: of what is measured, of what is expected */\n    ");
    put_numbers(f, (int)M(N), g->q, ",\n    ");
    put_numbers(f, (int)M(N), g->e, ",\n");
    put_constant(f, g->settle, "settle, ticks: until then the gains are those of a start");
    fprintf(f, "    /* states, and the covariance of z, zd with z there: steady, of a start */\n    {");
    for (c = 0; c < (int)M(centres); c++)
        put_numbers(f, (int)M(n), g->z[c], c + 1 < (int)M(centres) ? ",\n     " : "},\n    {{");
    for (c = 0; c < 2 * (int)M(centres); c++)
        put_numbers(f, 2 * (int)M(n) * (int)M(n), g->P[c / (int)M(centres)][c % (int)M(centres)],
                    c == (int)M(centres) - 1 ? "},\n     {" : c + 1 < 2 * (int)M(centres) ? ",\n      " : "}}\n");
    fprintf(f, "};\n");
}

/* Marks this header of a training, and stops a program that has the other one of another training, whichever comes first. */
static void put_sum(FILE *f, const char *header, const char *other)
{
    const unsigned long sum = (unsigned long)weights_sum;
    fprintf(f,
            "#if defined " STRING(MODEL) "_%s_SUM && " STRING(MODEL) "_%s_SUM != 0x%08lx\n#error \"" STRING(
                MODEL) "_limits.h and " STRING(MODEL) "_weights.h are of two trainings: take both of one\"\n#endif\n"
                       "#define " STRING(MODEL) "_%s_SUM 0x%08lx\n",
            other, other, sum, header, sum);
}

/* OUT_limits.h; verdict: what is said of the weights, NULL: nothing. */
static void write_settings(const char *verdict)
{
    FILE *f = file(".part", "w");
    if (!f) return;
    fprintf(f,
            "/* What is known of doubt, limits of a guard, noise of a filter and gains of an observer for the weights that were\n"
            "   written with it, fitted to recordings.\n"
            "   Include it behind the header of the config and the weights. */\n");
    if (verdict) fprintf(f, MARK "%s */\n", verdict);
    fprintf(f, "#ifndef ROLN_H\n#error \"include the header of the config, " STRING(MODEL) ".h, first\"\n#endif\n");
    fprintf(f,
            "#ifndef " STRING(MODEL) "_limits_h\n#define " STRING(
                MODEL) "_limits_h\n"
                       "typedef char " STRING(MODEL) "_limits_are_of_N_%d[" STRING(MODEL) "_N == %d && " STRING(
                           MODEL) "_force_size == %d ? 1 : "
                                  "-1];\n",
            (int)M(N), (int)M(N), (int)M(force_size));
    put_sum(f, "LIMITS", "WEIGHTS");
    put_evidence(f);
    put_limits(f);
    put_noise(f);
    put_gains(f);
    fprintf(f, "\n#endif\n");
    put_in_place(f, "_limits.h");
}

#endif
