/* SPDX-License-Identifier: MIT */
/* report.h - what a model is worth that train.c has trained: roll-outs of recordings against the recordings.

   train.c includes it behind its state `s`, its recordings `d` and its threads, which the functions below use.

       errors    E_q, E_qd at one horizon, of the model and of q + h qd
       table     errors at all horizons, printed and as CSV
       torques   torques by inverse dynamics against recorded ones, M, friction
       draw_..   files of the learning curve, and of recordings beside their prediction; put_..: the same in a page
       object    says why the model is no trained model

   q + h qd is the prediction of a constant velocity. A model is better than it at a horizon if its E_q is less than 1 / BETTER of
   that of q + h qd. Only horizons count at which q + h qd is off by 0.01 % and more than what the chart and the noise of the
   recordings leave, four times, which no model can predict; with smoother= also by more than the noise of the encoders. The others
   are printed in parentheses. The longest one up to look= may count though q + h qd is off by less than 0.01 %.

   1 errors     2 table     3 torques     4 pictures */

#ifndef REPORT_H
#define REPORT_H

#include "plot.h"

/* Reasons why there is no trained model, apart by "; "; empty: there is one. */
static char objections[600];

static void object(const char *format, ...)
{
    const size_t at = strlen(objections);
    va_list list;
    if (at > 0) snprintf(objections + at, sizeof objections - at, "; ");
    va_start(list, format);
    vsnprintf(objections + strlen(objections), sizeof objections - strlen(objections), format, list);
    va_end(list);
}

/* ---- 1 errors ---- */

/* A window fails if its roll-out ends with a status, or this many times farther off than the recording is wide. */
#define FAR 100

/* E_q, E_qd of the windows that did not fail, their standard errors, and how many of how many failed. median, tenth: errors of q
   that half of all windows and a tenth of them exceed, in the measure of E_q; NaN if that window failed. typical: the geometric
   mean of E_q over the trajectories, in which a wild one counts no more than others. If a part f of the windows of one failed, its
   E_q counts to the power of 1 - f, times FAR^f: so a few do not decide which weights are best, and yet each is a loss. Of each
   joint: E_q, NaN if it does not move, and the rms of q_pred - q in its unit; worst: the joint with the largest E_q. Trajectories
   that are too short for a window count for nothing. */
typedef struct {
    double q, qd, q_error, qd_error, median, tenth, typical, joint_q[M(N)], joint_rms[M(N)];
    double constant, floor; /* E_q of q + h qd over the same windows; what noise leaves of it, as far as the recordings tell */
    int failed, windows, worst, used; /* used: trajectories that are long enough for a window */
} error;

typedef struct {
    double sum[4];         /* of |q_pred - q|^2, |q - qbar|^2, |qd_pred - qd|^2, |qd|^2 */
    double constant[2];    /* of |q + h qd - q(h)|^2, and of |q + integral of qd - q(h)|^2, of windows that did not fail */
    double joint[M(N)][2]; /* of |q_pred - q|^2, |q - qbar|^2 of each joint */
    int failed, windows;
} score;

typedef struct {
    const motion *m;
    const M(params) *p;
    int from, count, samples, stride, every, first, *start; /* first: of this process, counted from `from` */
    double *off;   /* |q_pred - q|^2 of each window, HUGE_VAL if it failed; those of a trajectory begin at its first sample */
    score *scores; /* of trajectories from .. from + count - 1 */
} rollout;

/* How much of a longer work such roll-outs are. */
static struct {
    const char *what;
    double done, part;
} bar;

/* Seconds and steps of all roll-outs so far, from which the time of others is estimated. */
static struct {
    double seconds, steps;
} spent;

static double price(void)
{
    return spent.steps > 0 ? spent.seconds / spent.steps : 0;
}

/* Adds what M(errors) found of some windows. */
static void add_errors(const roln_error *all, const roln_error *joints, score *to)
{
    int j;
    to->sum[0] += (double)all->q, to->sum[1] += (double)all->q_var;
    to->sum[2] += (double)all->qd, to->sum[3] += (double)all->qd_var;
    for (j = 0; j < (int)M(N); j++)
        to->joint[j][0] += (double)joints[j].q, to->joint[j][1] += (double)joints[j].q_var;
}

/* The units of the joints in p, which stand behind slope, eigenvalue_floor and scale.q, .t, .m: number 5. NULL: ROLN_SCALE is
   common, they have one. */
static const roln_real *units_of(const M(params) *p)
{
    return M(own) ? (const roln_real *)(const void *)p + 5 : NULL;
}

/* Adds the errors of q + h qd over one window, and of q + the integral of the recorded qd: the latter is noise. */
static void add_constant(const rollout *r, int start, score *to)
{
    enum { N = M(N) };
    const roln_real *each = units_of(r->p), *q = r->m->q + start * N, *qd = r->m->qd + start * N;
    const double dt = r->m->dt;
    int i, j;
    for (j = 0; j < N; j++) {
        const double unit = each ? (double)each[j] : 1;
        const roln_real end = q[r->samples * N + j], ahead = q[j] + (roln_real)(r->samples * dt) * qd[j];
        const double off = (double)(ahead - roln_lnn_near(&M(model).lnn, j, ahead, end)) / unit;
        double drift = (double)q[j] - (double)end;
        for (i = 0; i < r->samples; i++)
            drift += dt * ((double)qd[i * N + j] + (double)qd[(i + 1) * N + j]) / 2;
        to->constant[0] += off * off, to->constant[1] += drift * drift / (unit * unit);
    }
}

/* The windows of trajectory `at` one by one, without those that fail. */
static void roll_each(const rollout *r, int at, roln_batch b, roln_real dt, score *to, int thread)
{
    enum { N = M(N) };
    const roln_real *each = units_of(r->p);
    const int *start = b.start, windows = b.count, a = r->m->first[at], end = r->m->first[at + 1];
    double *off = r->off + a, wide = 0;
    int w, i, j;
    for (i = a; i < end; i++)
        for (j = 0; j < N; j++) {
            const roln_real q = r->m->q[i * N + j];
            const double x = (double)(q - roln_lnn_near(&M(model).lnn, j, q, s.qbar[j])) / (each ? (double)each[j] : 1);
            wide += x * x / (end - a);
        }
    b.count = 1;
    for (w = 0; w < windows; w++) {
        const int end_of = b.steps > 0;
        roln_error e[2], joints[2 * N];
        const roln_errors out = {e, joints, NULL};
        b.start = start + w;
        if (M(errors)(r->p, &b, dt, end_of ? b.steps : 1, s.qbar, &out, &work[thread].errors) || e[end_of].q > FAR * FAR * wide)
            to->failed++, off[w] = HUGE_VAL;
        else add_errors(e + end_of, joints + end_of * N, to), add_constant(r, start[w], to), off[w] = e[end_of].q;
    }
}

/* Windows of trajectory k of this process. */
static void roll(void *ctx, int k, int thread)
{
    const rollout *r = ctx;
    enum { N = M(N) };
    const int number = r->first + k, at = r->from + number, steps = r->samples / r->stride, end = steps > 0;
    const roln_real dt = (roln_real)(r->m->dt * r->stride);
    int *start = r->start + r->m->first[at], i;
    score *to = &r->scores[number];
    roln_error e[2], joints[2 * N];
    roln_errors out = {e, joints, NULL};
    roln_batch b = {.steps = steps, .stride = r->stride, .start = start, .q = r->m->q, .qd = r->m->qd};
    b.tau = acts() ? r->m->tau : NULL;
    b.count = to->windows = windows(r->m, at, at + 1, r->samples, r->every, 0, start);
    if (thread == 0) progress(bar.what, bar.done + bar.part * number / r->count);
    if (b.count == 0) return;
    out.windows = room(2 * (size_t)b.count, sizeof *out.windows);
    if (M(errors)(r->p, &b, dt, end ? steps : 1, s.qbar, &out, &work[thread].errors) || e[end].q > FAR * FAR * e[end].q_var)
        roll_each(r, at, b, dt, to, thread);
    else {
        add_errors(e + end, joints + end * N, to);
        for (i = 0; i < b.count; i++)
            add_constant(r, start[i], to), r->off[r->m->first[at] + i] = out.windows[end * b.count + i].q;
    }
    free(out.windows);
}

/* Sends the errors of the windows of each process to all others. */
static void gather_off(const rollout *r)
{
    int *at = room((size_t)processes + 1, sizeof *at), p;
    for (p = 0; p <= processes; p++)
        at[p] = r->m->first[r->from + cut_at(r->count, p)];
    gather(r->off, sizeof *r->off, at);
    free(at);
}

/* sqrt(sum a / sum b), and its standard error: each trajectory left out in turn (jackknife). */
static double ratio(int count, const score *scores, int which, double *off)
{
    double a = 0, b = 0, mean = 0, square = 0;
    int counted = 0, k;
    for (k = 0; k < count; k++)
        a += scores[k].sum[which], b += scores[k].sum[which + 1], counted += scores[k].sum[which + 1] > 0;
    for (k = 0; k < count; k++) {
        const double e = sqrt(fabs(a - scores[k].sum[which]) / fmax(b - scores[k].sum[which + 1], 1e-30));
        if (!(scores[k].sum[which + 1] > 0)) continue; /* too short for a window, or all failed */
        mean += e / counted, square += e * e / counted;
    }
    *off = counted > 1 ? sqrt(fmax(0, square - mean * mean) * (counted - 1)) : (double)NAN; /* of one nobody knows */
    return b > 0 ? sqrt(a / b) : (double)NAN;
}

/* log E_q of a trajectory, failed windows by their part. */
static double log_of(const score *x)
{
    const double f = x->windows > 0 ? (double)x->failed / x->windows : 0;
    return (1 - f) * log(fmin(sqrt(fmax(x->sum[0], 1e-30) / fmax(x->sum[1], 1e-30)), 1e6)) + f * log(FAR);
}

/* E_q of q + h qd, and of the noise: that of the median trajectory, so that a wild sample does not hide all others. */
static void of_constant(int count, const score *scores, error *e)
{
    double *part = room((size_t)count, sizeof *part), a = 0, b = 0;
    int used = 0, k;
    for (k = 0; k < count; k++)
        if (scores[k].sum[1] > 0) {
            a += scores[k].constant[0], b += scores[k].sum[1];
            part[used++] = scores[k].constant[1] / scores[k].sum[1];
        }
    qsort(part, (size_t)used, sizeof *part, smaller);
    e->constant = b > 0 ? sqrt(a / b) : (double)NAN, e->floor = used > 0 ? sqrt(part[(used - 1) / 2]) : 0;
    free(part);
}

/* Errors that half of the windows and a tenth of them exceed. */
static void of_windows(const rollout *r, error *e)
{
    double *off = room((size_t)e->windows + 1, sizeof *off), spread = 0;
    int count = 0, k, i;
    for (k = 0; k < r->count; k++) {
        spread += r->scores[k].sum[1] / fmax(e->windows - e->failed, 1);
        for (i = 0; i < r->scores[k].windows; i++)
            off[count++] = r->off[r->m->first[r->from + k] + i];
    }
    qsort(off, (size_t)count, sizeof *off, smaller);
    e->median = e->tenth = (double)NAN;
    if (count > 0 && isfinite(off[(count - 1) / 2])) e->median = sqrt(off[(count - 1) / 2] / spread);
    if (count > 0 && isfinite(off[(9 * count - 1) / 10])) e->tenth = sqrt(off[(9 * count - 1) / 10] / spread);
    free(off);
}

/* E_q and rms of each joint, and which of those that move is the worst. */
static void of_joints(int count, const score *scores, error *e)
{
    const int good = e->windows - e->failed;
    int moves, j, k;
    for (j = 0; j < (int)M(N); j++) {
        double a = 0, b = 0;
        for (k = 0; k < count; k++)
            a += scores[k].joint[j][0], b += scores[k].joint[j][1];
        moves = b > 1e-10 * good * (double)s.qbar[j] * (double)s.qbar[j];
        e->joint_q[j] = moves ? sqrt(a / b) : (double)NAN, e->joint_rms[j] = good > 0 ? sqrt(a / good) : (double)NAN;
        if (moves && !(e->joint_q[j] <= e->joint_q[e->worst])) e->worst = j;
    }
}

/* Errors after `samples` samples in steps of `stride`, of windows every `every` samples of trajectories from .. from + count - 1;
   one by one in scores. */
static error errors(const motion *m, const M(params) *p, int from, int count, int samples, int stride, int every, score *scores)
{
    rollout r = {m, p, from, count, samples, stride, every, 0, NULL, NULL, scores};
    const double from_now = now();
    error e = {0};
    int k;
    memset(scores, 0, (size_t)count * sizeof *scores);
    r.start = room((size_t)m->samples, sizeof *r.start), r.off = room((size_t)m->samples, sizeof *r.off);
    r.first = cut_at(count, process);
    share(cut_at(count, process + 1) - r.first, roll, &r);
    gather_cuts(scores, sizeof *scores, count), gather_off(&r);
    e.q = ratio(count, scores, 0, &e.q_error), e.qd = ratio(count, scores, 2, &e.qd_error);
    for (k = 0; k < count; k++)
        e.used += scores[k].windows > 0, e.failed += scores[k].failed, e.windows += scores[k].windows;
    for (k = 0; k < count; k++)
        if (scores[k].windows > 0) e.typical += log_of(&scores[k]) / e.used;
    e.typical = e.used > 0 ? exp(e.typical) : (double)NAN;
    of_windows(&r, &e);
    of_joints(count, scores, &e);
    of_constant(count, scores, &e);
    spent.seconds += now() - from_now, spent.steps += (double)e.windows * (samples / stride + 1);
    free(r.start), free(r.off);
    return e;
}

/* In per cent; - where there is nothing to say. */
typedef struct { char text[16]; } percent;

static percent in_percent(double x)
{
    percent p;
    snprintf(p.text, sizeof p.text, x < 100 ? "%.3f" : x < 1000 ? "%.0f" : x >= 1000 ? "%.1e" : "-", 100 * x);
    return p;
}

/* How many of the trajectories were long enough, and what failed, if not all and none. */
typedef struct { char text[112]; } remarks;

static remarks remarks_on(const error *e, int trajectories)
{
    remarks r = {""};
    char used[48] = "";
    if (e->used < trajectories) snprintf(used, sizeof used, "  %d of %d long enough", e->used, trajectories);
    if (e->failed > 0) snprintf(r.text, sizeof r.text, "%s  %d of %d windows failed", used, e->failed, e->windows);
    else snprintf(r.text, sizeof r.text, "%s", used);
    return r;
}

/* ---- 2 table ---- */

enum { HORIZONS = 10, BETTER = 2, SEEN = 4 }; /* SEEN: so many times what nobody can predict q + h qd has to be off, to count */
#define LITTLE 1e-4                           /* and by so much */

typedef struct {
    int count, samples[HORIZONS], stride[HORIZONS];
} horizons;

/* Those that the longest of trajectories from .. to - 1 has room for. */
static horizons horizons_of(const motion *m, int from, int to)
{
    static const double ms[HORIZONS] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2995};
    const int stride = stride_of(m, 0.005);
    horizons h = {0, {0}, {0}};
    int longest = 0, i;
    for (i = from; i < to; i++)
        longest = longest > m->first[i + 1] - m->first[i] ? longest : m->first[i + 1] - m->first[i];
    for (i = 0; i < HORIZONS; i++) {
        const double x = floor(ms[i] * 1e-3 / m->dt + 0.5);
        if (x >= longest || (h.count > 0 && x <= h.samples[h.count - 1])) continue;
        h.samples[h.count] = (int)x, h.stride[h.count] = (int)x % stride ? 1 : stride;
        h.count++;
    }
    return h;
}

/* Steps of the roll-outs of windows every `every` samples to one horizon. */
static double steps_to(const motion *m, int from, int to, int samples, int stride, int every)
{
    double windows = 0;
    int k;
    for (k = from; k < to; k++) {
        const int starts = m->first[k + 1] - m->first[k] - samples;
        if (starts > 0) windows += (starts - 1) / every + 1;
    }
    return windows * (samples / stride + 1);
}

static double steps_of_table(const motion *m, int from, int to, int every)
{
    const horizons h = horizons_of(m, from, to);
    double all = 0;
    int i;
    for (i = 0; i < h.count; i++)
        all += steps_to(m, from, to, h.samples[i], h.stride[i], every);
    return all;
}

/* Nonzero if a look goes so far; if a training window does. */
static int within_look(double ms)
{
    return ms <= 1001 * s.ahead;
}

static int within_window(double ms)
{
    return ms < 1001 * (set("window") > 0 ? set("window") : 0.5);
}

/* Error that a model has to beat at a horizon: q + h qd and, as far as a training window reaches, the mean of q. */
static double rival_of(const error *e, double ms)
{
    return within_window(ms) && e->constant > 1 ? 1 : e->constant;
}

/* Recordings from .. to - 1 of m, of which a table is. */
typedef struct {
    const char *name;
    const motion *m;
    int from, to;
} judged;

static int limited_by_torques(const judged *of, int samples, const error *e); /* baseline.h */

/* Says once a table where the model is not better than its rival, up to look=, or where it fails too often or is off by half of the
   motion, up to look= or window=. counts: q + h qd is off by more than nobody can predict. */
static void judge(const judged *by, int samples, const error *e, int counts, int *said)
{
    const double ms = 1e3 * samples * by->m->dt;
    const char *const of = by->name;
    if (*said || !(within_look(ms) || within_window(ms))) return;
    if (within_look(ms) && counts && !(BETTER * e->q <= rival_of(e, ms)) && !limited_by_torques(by, samples, e))
        object("%s: E_q after %.4g ms is %.3g %%, more than 1/%d of the error of %s, %.3g %%", of, ms, 100 * e->q, BETTER,
              rival_of(e, ms) < e->constant ? "the mean of q" : "q + h qd", 100 * rival_of(e, ms));
    else if (20 * e->failed > e->windows)
        object("%s: %d of %d windows of %.4g ms failed", of, e->failed, e->windows, ms);
    else if (within_window(ms) && !(BETTER * e->q <= 1))
        object("%s: E_q after %.4g ms is %.3g %%, and the mean of q has 100 %%", of, ms, 100 * e->q);
    else return;
    *said = 1;
}

/* Prints one line, and writes it as CSV. */
static void table_row(const char *name, double ms, const error *e, int trajectories, int counts, FILE *csv)
{
    char constant[24] = "-";
    int j;
    if (ms > 0) snprintf(constant, sizeof constant, counts ? "%s " : "(%s)", in_percent(e->constant).text);
    printf("%5.4g %8s %7s %8s %8s %11s %8s %7s %6d %8s %9.3g%s\n", ms, in_percent(e->q).text, in_percent(e->q_error).text,
           in_percent(e->median).text, in_percent(e->tenth).text, constant, in_percent(e->qd).text,
           in_percent(e->qd_error).text, e->worst + 1, in_percent(e->joint_q[e->worst]).text, e->joint_rms[e->worst],
           remarks_on(e, trajectories).text);
    fflush(stdout);
    if (!csv) return;
    fprintf(csv, "\"%s\",%g,%.5g,%.5g,%.5g,%.5g,%.5g,%.5g,%d,%d,%d", name, ms, 100 * e->q, 100 * e->q_error,
            100 * e->median, 100 * e->tenth, 100 * e->qd, 100 * e->qd_error, e->failed, e->windows, e->worst + 1);
    for (j = 0; j < (int)M(N); j++)
        fprintf(csv, ",%.5g,%.5g", 100 * e->joint_q[j], e->joint_rms[j]);
    fprintf(csv, ",%.5g,%d,%d\n", 100 * e->constant, counts, e->used);
}

static void table_head(FILE *csv)
{
    int j;
    if (!csv) return;
    fprintf(csv, "recordings,ms,E_q_percent,E_q_error,E_q_median_percent,E_q_90_percent,E_qd_percent,E_qd_error,failed,windows,"
                 "worst_joint");
    for (j = 1; j <= (int)M(N); j++)
        fprintf(csv, ",E_q%d_percent,rms_q%d", j, j);
    fprintf(csv, ",constant_velocity_percent,counts,recording_count\n");
}

static double encoders[M(N)]; /* deviations of the recorded q that smoother= has replaced; 0: it has not */

/* Returns the E_q that the noise of the encoders would make over the windows of scores; 0 without smoother=. The part that the
   smoother leaves of this noise is unknown, so the error of q + h qd has to exceed all of it. */
static double noise_of_encoders(int count, const score *scores)
{
    const roln_real *each = units_of(&s.p);
    double noise = 0, spread = 0;
    int windows = 0, j, k;
    for (j = 0; j < (int)M(N); j++)
        noise += pow(encoders[j] / (each ? (double)each[j] : 1), 2);
    for (k = 0; k < count; k++)
        spread += scores[k].sum[1], windows += scores[k].windows - scores[k].failed;
    return spread > 0 ? sqrt(noise * windows / spread) : 0;
}

/* The tables that were printed, for page.h: of held-out recordings, and of test=. */
static struct {
    char name[200];
    int trajectories, rows;
    struct {
        double ms;
        int counts;
        error e;
    } row[HORIZONS];
} kept_tables[2];
static int tables_kept;

/* Errors over the time that is predicted ahead, printed and as lines of a CSV; csv NULL: none. `name` is for the CSV, `of` for the
   reader. It takes about `time` seconds: windows begin every 25 ms, or less often. */
static void table(const char *name, const char *of, const motion *m, int from, int to, double time, FILE *csv)
{
    const horizons h = horizons_of(m, from, to);
    const judged by = {of, m, from, to};
    const int usual = stride_of(m, 0.025);
    score *scores = room((size_t)(to - from), sizeof *scores);
    double all, done = 0, chart = 0;
    int every = usual, said = 0, counted = 0, at = tables_kept++, looked = 0, i;
    while (price() * (all = steps_of_table(m, from, to, every)) > time && every < m->samples / 2)
        every *= 2;
    printf("%s\n", name);
    for (i = 0; i < (int)M(N); i++)
        if (!changes(m, m->q, M(N), i)) printf("joint %d does not move in any recording: it tells nothing of the model\n", i + 1);
    if (every > usual) printf("(a window every %.3g ms, for time is short)\n", 1e3 * every * m->dt);
    printf("   ms    E_q %%      +-   median     90 %%   q + h qd    E_qd %%      +-  worst joint   E_q %%      rms\n");
    while (looked + 1 < h.count && within_look(1e3 * h.samples[looked + 1] * m->dt))
        looked++;
    for (i = 0; i < h.count; i++) {
        const double ms = 1e3 * h.samples[i] * m->dt, part = steps_to(m, from, to, h.samples[i], h.stride[i], every) / fmax(all, 1);
        int counts;
        error e;
        bar.what = "table of errors", bar.done = done, bar.part = part;
        e = errors(m, &s.p, from, to - from, h.samples[i], h.stride[i], every, scores);
        done += part;
        if (i == 0) chart = e.q;
        counts = h.samples[i] > 0 && e.constant > SEEN * sqrt(chart * chart + e.floor * e.floor) &&
                 e.constant > noise_of_encoders(to - from, scores) && (e.constant > LITTLE || i == looked);
        table_row(name, ms, &e, to - from, counts, csv);
        kept_tables[at].row[i].ms = ms, kept_tables[at].row[i].counts = counts, kept_tables[at].row[i].e = e;
        judge(&by, h.samples[i], &e, counts, &said);
        counted += counts && i <= looked;
    }
    snprintf(kept_tables[at].name, sizeof kept_tables[at].name, "%s", name);
    kept_tables[at].trajectories = to - from, kept_tables[at].rows = h.count;
    if (counted == 0) object("%s: at no horizon up to look= q + h qd is off by more than noise and chart leave", of);
    free(scores);
}

/* ---- 3 torques ---- */

enum {
    /* torques of joints, else of latent coordinates, in J */
    JOINTS = (int)M(n) == (int)M(N) && (int)M(inputs) == 0 && (int)M(actuator) == 0 && (int)M(driven) == 0,
    TORQUES = JOINTS ? (int)M(N) : (int)M(n)
};

/* The unit of a column of motion.csv behind its factor and gain; "as it is" if nobody says, or there is no such column. */
static const char *unit_of_column(int kind, int index)
{
    int c;
    for (c = 0; c < d.count; c++) {
        const field *f = &d.fields[c];
        const int unit = f->kind == kind && f->index == index ? find_unit(kind, f->unit, (int)strlen(f->unit)) : -1;
        if (unit >= 0 && kind == OF_TAU && strchr(f->unit, '*') && !strchr(known_units[unit].si, 'N'))
            return (int)M(inputs) > 0 ? "as its gain" : strcmp(unit_of_column(OF_Q, index), "m") == 0 ? "N" : "Nm";
        if (unit >= 0) return known_units[unit].si;
    }
    return "as it is";
}

/* Sums over samples: of each joint, or latent coordinate. */
typedef struct {
    double tau[TORQUES], off[TORQUES], speed[TORQUES], model[TORQUES]; /* of squares; model: torques of the model */
    double mean[TORQUES], mean_model[TORQUES], both[TORQUES];          /* of tau, of torques of the model, of their products */
    int samples;
} torque_sums;

/* Recorded torques of a sample of m, those of the model there by inverse dynamics, their part M qdd, and velocities, of each joint
   or latent coordinate; inertial NULL: not asked. Returns 0 if the model cannot be evaluated there. */
static int torques_at(const M(params) * p, const motion *m, int sample, double *recorded, double *model, double *inertial,
                      double *speed)
{
    enum { N = M(N), F = M(force_size) };
    static M(work) scratch;
    static M(target) t;
    const roln_real *tau = m->tau_mid + sample * F, *qd = m->qd + sample * N;
    roln_real of_model[N + 1], of_tau[N + 1], latent_tau[M(n)], still[M(n)] = {0};
    M(latent) z;
    int j;
    if (M(encode_reference)(p, m->q + sample * N, qd, m->qdd + sample * N, &t, &scratch.encode_reference) != ROLN_OK) return 0;
    memcpy(z.z, t.z, sizeof z.z), memcpy(z.zd, t.zd, sizeof z.zd);
    if (M(inverse)(p, &z, NULL, t.zdd, latent_tau, &scratch.inverse) != ROLN_OK) return 0;
    if (JOINTS) {
        if (M(lift)(p, &z, latent_tau, of_model, &scratch.lift) != ROLN_OK) return 0;
        memcpy(of_tau, tau, sizeof *tau * (size_t)TORQUES);
    } else {
        if (M(reduce)(p, &z, tau, of_tau, &scratch.reduce) != ROLN_OK) return 0;
        memcpy(of_model, latent_tau, sizeof latent_tau);
    }
    for (j = 0; j < TORQUES; j++) {
        recorded[j] = (double)of_tau[j], model[j] = (double)of_model[j];
        if (j >= TORQUES - (int)M(driven)) recorded[j] = model[j]; /* no force was recorded */
        speed[j] = JOINTS ? (double)qd[j] : (double)z.zd[j];
    }
    if (!inertial) return 1;
    if (M(inverse)(p, &z, NULL, still, latent_tau, &scratch.inverse) != ROLN_OK) return 0;
    if (JOINTS && M(lift)(p, &z, latent_tau, of_tau, &scratch.lift) != ROLN_OK) return 0;
    for (j = 0; j < TORQUES; j++)
        inertial[j] = model[j] - (double)(JOINTS ? of_tau[j] : latent_tau[j]);
    return 1;
}

/* Adds one sample; nothing if the model cannot be evaluated there. */
static void add_torque(const M(params) * p, const motion *m, int sample, torque_sums *to)
{
    double tau[TORQUES], model[TORQUES], speed[TORQUES];
    int j;
    if (!torques_at(p, m, sample, tau, model, NULL, speed)) return;
    for (j = 0; j < TORQUES; j++) {
        const double off = model[j] - tau[j];
        to->tau[j] += tau[j] * tau[j], to->off[j] += off * off, to->speed[j] += speed[j] * speed[j];
        to->mean[j] += tau[j], to->mean_model[j] += model[j], to->model[j] += model[j] * model[j], to->both[j] += tau[j] * model[j];
    }
    to->samples++;
}

/* Torques of the model over recorded ones: the rms, over joints, of the rms error of each over the rms of its torque. Of about a
   thousand samples of recordings from .. to - 1 of m; 0 if there are no torques. */
static double torque_error(const M(params) * p, const motion *m, int from, int to)
{
    enum { FEW = 1000 };
    const int step = (m->first[to] - m->first[from]) / FEW + 1;
    torque_sums sums;
    double all = 0;
    int joints = 0, k, i, j;
    memset(&sums, 0, sizeof sums);
    for (k = from; k < to; k++)
        for (i = m->first[k] + 1; i + 1 < m->first[k + 1]; i += step)
            add_torque(p, m, i, &sums);
    for (j = 0; j < TORQUES; j++)
        if (sums.tau[j] > 0) all += sums.off[j] / sums.tau[j], joints++;
    return joints > 0 ? sqrt(all / joints) : 0;
}

/* The middle of the range of training, at rest. */
static M(latent) middle(void)
{
    M(latent) z = {{0}, {0}};
    int i;
    for (i = 0; i < (int)M(n); i++)
        z.z[i] = (s.p.z_min[i] + s.p.z_max[i]) / 2;
    return z;
}

/* Forces and inertia of coordinate j. */
typedef struct {
    double friction, gravity, column[TORQUES]; /* column j of M */
} terms;

/* Terms at z, at rest but for coordinate j: a joint, or a latent one. Zeros if the model cannot be evaluated. */
static terms terms_at(M(latent) z, int j, double speed)
{
    enum { N = M(N), n = M(n) };
    static const terms none;
    static M(work) scratch;
    M(equation) e;
    M(state) x;
    roln_real unit[N] = {0}, column[N], friction[N + 1] = {0}, gravity[N + 1] = {0};
    terms t;
    int i;
    if (JOINTS) {
        if (M(decode)(&s.p, &z, &x, &scratch.decode) != ROLN_OK) return none;
        unit[j] = 1, x.qd[j] = (roln_real)speed;
        if (M(inertia)(&s.p, &z, unit, column, &scratch.inertia) != ROLN_OK) return none;
        if (M(encode)(&s.p, &x, &z, &scratch.encode) != ROLN_OK) return none;
        if (M(dynamics)(&s.p, &z, &e, &scratch.dynamics) != ROLN_OK) return none;
        if (M(lift)(&s.p, &z, e.d, friction, &scratch.lift) != ROLN_OK) return none;
        if (M(lift)(&s.p, &z, e.g, gravity, &scratch.lift) != ROLN_OK) return none;
    } else {
        z.zd[j] = (roln_real)speed;
        if (M(dynamics)(&s.p, &z, &e, &scratch.dynamics) != ROLN_OK) return none;
        friction[j] = e.d[j], gravity[j] = e.g[j];
        for (i = 0; i < n; i++)
            column[i] = e.M[i * n + j];
    }
    t.friction = (double)friction[j], t.gravity = (double)gravity[j];
    for (i = 0; i < TORQUES; i++)
        t.column[i] = (double)column[i];
    return t;
}

static torque_sums held_torques; /* of held-out samples, for page.h */

/* Torques of held-out samples by inverse dynamics, friction and M. */
static void torques(void)
{
    enum { SOME = 4000 };
    const char *const joint = JOINTS ? "joint" : "latent";
    const int step = (d.samples - d.first[train]) / SOME + 1;
    torque_sums sums;
    terms t[TORQUES];
    double all = 0, all_off = 0;
    int wrong = 0, poor = 0, k, i, j;
    memset(&sums, 0, sizeof sums);
    for (k = train; k < d.trajectories; k++)
        for (i = d.first[k] + 1; i + 1 < d.first[k + 1]; i += step)
            add_torque(&s.p, &d, i, &sums);
    printf("torques by inverse dynamics at %d held-out samples, %s\n", sums.samples,
           JOINTS ? "in the unit of tau" : "of latent coordinates, in the unit of tau times q");
    printf("%6s   rms tau   tau_model - tau, rms       %%   friction   at speed\n", joint);
    for (j = 0; j < TORQUES; j++) {
        const double tau = sqrt(sums.tau[j] / fmax(sums.samples, 1)), off = sqrt(sums.off[j] / fmax(sums.samples, 1));
        const double speed = sqrt(sums.speed[j] / fmax(sums.samples, 1));
        t[j] = terms_at(middle(), j, speed);
        printf("%6d %9.3g %22.3g %9s %10.3g %10.3g%s\n", j + 1, tau, off, in_percent(tau > 0 ? off / tau : (double)NAN).text,
               t[j].friction, speed, JOINTS && !changes(&d, d.q, M(N), j) ? "  does not move" : "");
        wrong += tau > 0 && !(off < tau), poor += tau > 0 && off < tau && off >= 0.1 * tau;
        all += sums.tau[j], all_off += sums.off[j];
    }
    held_torques = sums;
    printf("M at the middle of the range, in the unit of tau%s\n", JOINTS ? " / qdd" : " times q");
    for (i = 0; i < TORQUES; i++) {
        printf("%6d", i + 1);
        for (j = 0; j < TORQUES; j++)
            printf(" %9.3g%s", t[j].column[i], j % 9 == 8 && j + 1 < TORQUES ? "\n      " : "");
        printf("\n");
    }
    if (wrong > 0)
        printf("warning: torques of %d of %d are off by more than they are themselves; possible cause: force=0, noise of qdd "
               "(smooth=), or torques that act later\n",
               wrong, TORQUES);
    if (poor > 0)
        printf(
            "warning: torques of %d of %d are off by 10 %% or more; possible cause: torques that act later than they are recorded, "
            "another unit, friction that the config has not (ROLN_DAMPING, ROLN_FRICTION), noise of qdd (smooth=)\n",
            poor, TORQUES);
    if (all > 0 && !(all_off < all))
        object("torques of the model are off by %.3g %% of the recorded ones", 100 * sqrt(all_off / all));
}

/* ---- 4 pictures ---- */

static double curve_ahead[2]; /* s, of the errors in s.point */

/* E_q of held-out trajectories, near and far, over seconds; logarithmic. */
static void put_curve(FILE *f, int alone)
{
    const double end = fmax(s.point[s.points - 1][0], 1);
    frame p = {f, 60, 60, 540, 300, {0, 0}, {-3, 2}};
    double x[POINTS], y[POINTS];
    int k, i;
    p.x[1] = end;
    svg_begin(f, 640, 400, alone);
    svg_text(f, 60, 28, "font-size='15'", STRING(MODEL) ": E_q of held-out recordings");
    for (k = -3; k <= 2; k++) {
        fprintf(f, "<path d='M60 %dh560' stroke='#e4e4e4'/>", 180 - 60 * k);
        svg_text(f, 54, 184 - 60 * k, "text-anchor='end'", "%g %%", pow(10, k));
    }
    for (k = 0; k <= 4; k++)
        svg_text(f, 60 + 135 * k, 382, "text-anchor='middle'", "%.3g%s", end * k / 4, k == 4 ? " s" : "");
    for (i = 0; i < 2; i++) {
        char fill[20];
        snprintf(fill, sizeof fill, "fill='%s'", svg_colours[i ? RED : BLUE]);
        svg_text(f, 60 + 140 * i, 50, fill, "%.4g ms ahead", 1e3 * curve_ahead[i]);
        for (k = 0; k < s.points; k++)
            x[k] = s.point[k][0], y[k] = log10(fmin(fmax(100 * s.point[k][1 + i], 1e-3), 100));
        svg_curve(&p, svg_colours[i ? RED : BLUE], 2, s.points, x, y);
    }
    svg_end(f);
}

/* OUT.svg: the learning curve. */
static void draw_curve(double near, double far)
{
    FILE *f = file(".svg", "w");
    curve_ahead[0] = near, curve_ahead[1] = far;
    if (!f) return;
    put_curve(f, 1);
    close_file(f, ".svg");
}

enum { ACROSS = 440, DOWN = 110, CURVES = 4 };

/* A held-out trajectory, and as the model predicts it. */
typedef struct {
    int at, points, stride;
    double typical, *x; /* E_q; x [points][N]: NaN where the prediction failed */
} shown;

static shown shown_motion[2]; /* predicted with the median and the worst E_q; x NULL: not yet chosen */

/* Joint j of a trajectory, recorded and predicted. */
static void put_joint(FILE *f, const shown *m, int j, int left, int top)
{
    enum { N = M(N) };
    const int a = d.first[m->at], samples = d.first[m->at + 1] - a;
    double *y = room((size_t)samples, sizeof *y);
    frame p = {f, 0, 0, ACROSS - 40, DOWN - 30, {0, 0}, {1, -1}};
    int i;
    p.left = left, p.top = top + 20, p.x[1] = m->points;
    for (i = 0; i < samples; i++)
        y[i] = (double)d.q[(a + i) * N + j];
    svg_extend(p.y, samples, y);
    svg_text(f, left, top + 12, "", "joint %d, %.3g .. %.3g, unit: %s", j + 1, p.y[0], p.y[1], unit_of_column(OF_Q, j));
    svg_widen(p.y);
    for (i = 0; i < m->points; i++)
        y[i] = (double)d.q[(a + i * m->stride) * N + j];
    svg_curve(&p, svg_colours[GREY], 2, m->points, NULL, y);
    for (i = 0; i < m->points; i++)
        y[i] = m->x[i * N + j];
    svg_curve(&p, svg_colours[RED], 1, m->points, NULL, y);
    free(y);
}

/* A trajectory as the model predicts it from its first sample, and every `far` samples anew from the recording: x [points][N]. */
static void predict(int at, int stride, int far, int points, double *x)
{
    enum { N = M(N), F = M(force_size) };
    static M(work) scratch;
    M(state) now_at;
    M(latent) z;
    roln_status st = ROLN_OK;
    int i, j, k;
    for (k = 0; k < points; k++) {
        const int sample = d.first[at] + k * stride;
        roln_real tau[F];
        if (k * stride % far == 0) {
            memcpy(now_at.q, d.q + sample * N, sizeof now_at.q), memcpy(now_at.qd, d.qd + sample * N, sizeof now_at.qd);
            st = M(encode)(&s.p, &now_at, &z, &scratch.encode);
        } else if (st == ROLN_OK) {
            for (j = 0; j < F; j++)
                for (i = 0, tau[j] = 0; i < stride; i++)
                    tau[j] += d.tau[(sample - stride + i) * F + j] / (roln_real)stride;
            st = M(step)(&s.p, &z, acts() ? tau : NULL, (roln_real)(d.dt * stride), &scratch.step);
        }
        if (st == ROLN_OK) st = M(decode)(&s.p, &z, &now_at, &scratch.decode);
        for (j = 0; j < N; j++)
            x[k * N + j] = st == ROLN_OK ? (double)now_at.q[j] : (double)NAN;
    }
}

/* The joints of a trajectory that move most, in their own units if they have such. */
static void widest(int at, int count, int *which)
{
    enum { N = M(N) };
    const roln_real *each = units_of(&s.p);
    double wide[N];
    int i, j, k;
    for (j = 0; j < N; j++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (i = d.first[at]; i < d.first[at + 1]; i++)
            low = fmin(low, (double)d.q[i * N + j]), high = fmax(high, (double)d.q[i * N + j]);
        wide[j] = (high - low) / (each ? (double)each[j] : 1);
    }
    for (k = 0; k < count; k++) {
        for (j = 1, which[k] = 0; j < N; j++)
            if (wide[j] > wide[which[k]]) which[k] = j;
        wide[which[k]] = -1;
    }
}

/* The held-out trajectories that are predicted with the median and the worst E_q, as the model predicts them. */
static void choose_shown(void)
{
    const int count = d.trajectories - train, stride = stride_of(&d, 0.005);
    const int far = s.ahead > 0 ? (int)(s.ahead / d.dt + 0.5) : stride; /* no look: no stage had anything to do */
    score *scores = room((size_t)count, sizeof *scores);
    int chosen[2] = {0, 0}, k, i;
    error e;
    bar.what = "picture", bar.done = 0, bar.part = 1;
    e = errors(&d, &s.p, train, count, far, stride, stride_of(&d, 0.1), scores);
    for (k = 0; k < count; k++) {
        int below = 0;
        if (scores[k].windows == 0) continue;
        for (i = 0; i < count; i++)
            below += scores[i].windows > 0 &&
                     (log_of(&scores[i]) < log_of(&scores[k]) || (log_of(&scores[i]) == log_of(&scores[k]) && i < k));
        if (below == (e.used - 1) / 2) chosen[0] = k;
        if (below == e.used - 1) chosen[1] = k;
    }
    for (k = 0; k < 2; k++) {
        shown *m = &shown_motion[k];
        m->at = train + chosen[k], m->stride = stride, m->points = (d.first[m->at + 1] - d.first[m->at] - 1) / stride + 1;
        m->typical = exp(log_of(&scores[chosen[k]])), m->x = room((size_t)m->points * M(N), sizeof *m->x);
        predict(m->at, stride, far, m->points, m->x);
    }
    free(scores);
}

/* Their joints that move most, `most` at most. */
static void put_motion(FILE *f, int most, int alone)
{
    enum { N = M(N) };
    static const char *const title[] = {"median", "worst"};
    const int count = (int)N < most ? (int)N : most, height = 60 + count * DOWN;
    int joint[N], k, i;
    svg_begin(f, 2 * ACROSS, height, alone);
    for (k = 0; k < 2; k++) {
        const shown *m = &shown_motion[k];
        const int left = 20 + k * ACROSS;
        svg_text(f, left, 24, "font-size='15'", "%s: recording %d of %d, E_q %s %%", title[k], m->at + 1, d.trajectories,
                 in_percent(m->typical).text);
        svg_text(f, left, 42, "", "%.3g s: grey recorded, red predicted, anew every %.3g s", m->points * m->stride * d.dt, s.ahead);
        widest(m->at, count, joint);
        for (i = 0; i < count; i++)
            put_joint(f, m, joint[i], left, 50 + i * DOWN);
    }
    svg_end(f);
}

/* OUT_motion.svg. */
static void draw_motion(void)
{
    FILE *f = file("_motion.svg", "w");
    choose_shown();
    if (!f) return;
    put_motion(f, CURVES, 1);
    close_file(f, "_motion.svg");
}

#endif
