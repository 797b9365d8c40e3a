/* SPDX-License-Identifier: MIT */
/* recording.h - recorded motion from a CSV file, for train.c, and what may be wrong with it.

   A line is a sample: the columns t, q.., qd.., tau.. apart by commas or blanks; t in seconds, qd in units of q per second. A blank
   line stands between trajectories. A header line may come first. tau is held from its sample to the next; of a model with a
   learned input map (ROLN_INPUTS) these columns are its inputs u. Columns may be left out: tau, and, if the positions are smoothed,
   qd.

   Of a joint that the model takes for an angle (ROLN_ANGLES), q may jump by turns: it is read without them.

   What would make a training useless ends the program with file, line and what to do: steps of t that differ, t in milliseconds,
   qd 0 throughout. What may be meant is a warning: qd that is not dq/dt, with the likely cause; a joint that goes over more than a
   turn, and is no angle of the model.

   1 messages     2 lines of a file     3 time stamps     4 velocities     5 noise, smoothing     6 a recording */

#ifndef RECORDING_H
#define RECORDING_H

#include "roln_spd.h"
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct {
    const char *path;
    int N, forces;                     /* columns q; columns tau or u */
    int trajectories, samples, *first; /* first [trajectories + 1] */
    int has_qd, has_tau;
    double dt;
    roln_real *q, *qd, *qdd;  /* [samples][N] */
    roln_real *tau, *tau_mid; /* [samples][forces]; mean of the forces held before and after a sample: of a central difference */
} motion;

/* What a model asks of a file. */
typedef struct {
    const char *model;
    int N, inputs; /* inputs of a learned input map, 0: none */
    int torque;    /* nonzero: tau is needed */
    int half;      /* samples on each side that positions are smoothed over, 0: not */
    int qd_unused; /* nonzero: q alone is used */
    unsigned angles; /* bit j: joint j is an angle in radians */
} wanted;

/* ---- 1 messages ---- */

#ifndef SILENT
#define SILENT 10 /* s without a word, at most */
#endif

enum { DONE, WRONG, LOST }; /* exit codes: what the user can mend; a training that came to nothing */

static void end_with(int code, const char *format, va_list list)
{
    fflush(stdout);
    vfprintf(stderr, format, list);
    fputc('\n', stderr);
    exit(code);
}

/* Message and exit: wrong use, recordings or files. */
static void fail(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    end_with(WRONG, format, list);
    va_end(list);
}

/* Seconds from some instant on. */
static double now(void)
{
#ifdef NO_THREADS
    return (double)clock() / CLOCKS_PER_SEC;
#else
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
#endif
}

/* Nonzero if there was no such call with this answer for a while. */
static int due(void)
{
    static double said = -1;
    const double t = now();
    if (said < 0) said = t;
    if (t - said < SILENT) return 0;
    said = t;
    return 1;
}

/* Says now and then what part of something is done, if it takes long; a part of 0 is its beginning. */
static void progress(const char *what, double part)
{
    static double began;
    const double spent = part > 0 ? now() - began : 0, left = part > 0 ? spent * (1 - part) / part : 0;
    if (part <= 0) began = now();
    if (!(part > 0) || spent < SILENT || left < SILENT / 10.0 || !due()) return;
    printf("%s: %.0f %%, %.0f s left\n", what, 100 * part, left);
    fflush(stdout);
}

/* Room for count things of one size, of zeros; more than a size_t can say is more than there is. */
static void *room(size_t count, size_t size)
{
    void *p = calloc(count ? count : 1, size);
    if (!p) fail("out of memory: %.0f times %.0f bytes", (double)count, (double)size);
    return p;
}

/* ---- 2 lines of a file ---- */

/* A file that is being read: time and line of each sample, and a line of text. */
typedef struct {
    FILE *f;
    int lines, row, columns; /* lines of the file; the line that was read last, its columns */
    int *line, size;         /* size of text */
    int force;               /* column that a header calls tau.. or u.., from 0; 0: none */
    double *t, *v;
    char *text;
} sheet;

/* Numbers of one line, the first `most` of them into v. Returns how many there are; what is none ends the program. */
static int read_line(const char *path, int row, const char *line, int most, double *v)
{
    const char *p = line;
    char *end;
    int n = 0;
    for (;;) {
        const double x = strtod(p, &end);
        if (end != p && *end == ';') fail("%s, line %d: columns stand apart by commas or blanks, not by ;", path, row);
        if (end == p || !(fabs(x) < 3e38)) fail("%s, line %d: column %d is not a finite number: %.10s", path, row, n + 1, p);
        if (n < most) v[n] = x;
        n++;
        p = end + strspn(end, " \t\r\n");
        if (*p == 0) return n;
        if (*p == ',') p++;
    }
}

/* Nonzero if the first word of a line is no number: a header. nan is a number, if a wrong one; nanoseconds only begins like one. */
static int is_header(const char *line)
{
    const char *word = line + strspn(line, ", \t\r\n\v\f");
    char *end;
    strtod(word, &end);
    return *word != 0 && (end == word || (!strchr("+-.0123456789", *word) && !strchr(",; \t\r\n\v\f", *end)));
}

/* The first column of a header that is called tau.. or u.., from 0; 0: none is. Names stand apart by commas, or where there is
   none by tabs, or blanks; a # before them all is none. */
static int force_column(const char *name)
{
    const char *const apart = strchr(name, ',') ? "," : strchr(name, '\t') ? "\t" : " \r\n";
    int c;
    name += strspn(name, " \t#");
    for (c = 0; *name; c++) {
        name += strspn(name, " \t\"'");
        if (c > 0 && (strncmp(name, "tau", 3) == 0 || *name == 'u')) return c;
        name += strcspn(name, apart);
        name += *apart == ',' ? *name == ',' : strspn(name, apart);
    }
    return 0;
}

/* What n columns are: 1 + N positions, 1 + 2 N with velocities, then forces, or with an input map 1 + N and inputs; as many forces
   as velocities would be are forces if a header says so, in column `named`. */
static void columns_are(motion *d, const wanted *w, int n, int named)
{
    const char *const force = w->inputs > 0 ? "u" : "tau";
    const int N = w->N, F = d->forces, ambiguous = F == N && named != 1 + N;
    d->has_qd = n == 1 + 2 * N + F || (n == 1 + 2 * N && (F != N || ambiguous));
    d->has_tau = n == 1 + 2 * N + F || (!ambiguous && n == 1 + N + F);
    if (!d->has_qd && !d->has_tau && n != 1 + N)
        fail("%s has %d columns, but %s needs t, %d q, %d qd: %d, or with %d %s %d; of positions alone %d", d->path, n, w->model, N,
             N, 1 + 2 * N, F, force, 1 + 2 * N + F, 1 + N);
    if (!d->has_tau && w->torque)
        fail("%s has no %s columns, which torque=1 needs%s", d->path, force,
             ambiguous && w->half > 0 && n == 1 + 2 * N ? "; without qd, a header says where they are: t,q1,..,tau1,.." : "");
    if (!d->has_qd && w->half == 0)
        fail("%s has no qd columns: with smooth=10, say, q, qd, qdd come from a parabola through 21 samples of q", d->path);
}

/* Reads text up to the end of its line, or as much as there is room for. Returns how many bytes; 0 at the end of the file. */
static int read_text(sheet *s)
{
    int n = 0, c = 0;
    while (n < s->size - 1 && c != '\n' && (c = getc(s->f)) != EOF)
        s->text[n++] = (char)c;
    s->text[n] = 0;
    return n;
}

/* Opens a file, counts its lines, and makes room for as many samples. */
static sheet open_sheet(motion *d, const wanted *w)
{
    const size_t row = (size_t)w->N * sizeof(roln_real);
    sheet s = {0};
    size_t lines;
    s.size = 64 * (1 + 3 * w->N) + 64;
    s.text = room((size_t)s.size, 1), s.v = room(1 + 3 * (size_t)w->N, sizeof *s.v);
    s.f = fopen(d->path, "r");
    if (!s.f) fail("cannot read %s", d->path);
    while (read_text(&s))
        if (s.lines++ == INT_MAX - 1) fail("%s has more than 2^31 lines; leave recordings out", d->path);
    rewind(s.f);
    if (s.lines == 0) fail("%s is empty", d->path);
    lines = (size_t)s.lines + 1;
    d->q = room(lines, row), d->qd = room(lines, row), d->qdd = room(lines, row);
    d->tau = room(lines, row), d->tau_mid = room(lines, row), d->first = room(lines, sizeof *d->first);
    s.t = room(lines, sizeof *s.t), s.line = room(lines, sizeof *s.line);
    return s;
}

/* The next line of text, without the mark that some programs begin a file with. Returns 0 at the end of the file, which is where it
   was when lines were counted: there is no room for more. */
static int next_line(const char *path, sheet *s)
{
    static const char mark[] = "\xef\xbb\xbf";
    const int n = read_text(s);
    if ((n > 0) == (s->row == s->lines))
        fail("%s: %s than when its lines were counted: a file that grew while it was read, or a pipe; copy it first", path,
             n > 0 ? "longer" : "shorter");
    if (n == 0) return 0;
    s->row++;
    if (memchr(s->text, 0, (size_t)n))
        fail("%s, line %d has a byte 0, which no text has: damaged, or UTF-16, which has to be saved as UTF-8", path, s->row);
    if (s->text[n - 1] != '\n' && !feof(s->f)) fail("%s, line %d is longer than %d letters", path, s->row, s->size - 2);
    if (s->row == 1 && strncmp(s->text, mark, 3) == 0) memmove(s->text, s->text + 3, strlen(s->text + 3) + 1);
    return 1;
}

/* The line read last becomes a sample. */
static void add_sample(motion *d, const wanted *w, sheet *s)
{
    const int N = d->N, F = d->forces, n = read_line(d->path, s->row, s->text, 1 + 3 * N, s->v);
    const double *v = s->v + 1;
    int i;
    if (s->columns == 0) columns_are(d, w, s->columns = n, s->force);
    if (n != s->columns) fail("%s, line %d has %d columns, the lines before it %d", d->path, s->row, n, s->columns);
    if (d->samples >= INT_MAX / (N > F ? N : F) - 1)
        fail("%s, line %d: more than 2^31 numbers; leave recordings out, or samples: every second one", d->path, s->row);
    s->t[d->samples] = s->v[0], s->line[d->samples] = s->row;
    for (i = 0; i < N; i++)
        d->q[d->samples * N + i] = (roln_real)v[i];
    v += N;
    for (i = 0; i < N && d->has_qd; i++)
        d->qd[d->samples * N + i] = (roln_real)v[i];
    v += d->has_qd ? N : 0;
    for (i = 0; i < F && d->has_tau; i++)
        d->tau[d->samples * F + i] = (roln_real)v[i];
    d->samples++;
}

/* ---- 3 time stamps ---- */

static int smaller(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* A step of t may differ from the others by 1 %. */
static int same_step(double step, double dt)
{
    return step > 0 && fabs(step - dt) <= 0.01 * dt;
}

/* Says what is wrong with the step to sample i, in trajectory k, and what to do; `off` of `steps` steps differ from d->dt. */
static void refuse_step(const motion *d, const sheet *s, int k, int i, int off, int steps)
{
    const double step = s->t[i] - s->t[i - 1], dt = d->dt, missing = step / dt - 1;
    const int length = d->first[k + 1] - d->first[k] - 1;
    int alike = 0, j;
    for (j = d->first[k] + 1; j < d->first[k + 1]; j++)
        alike += same_step(s->t[j] - s->t[j - 1], step);
    if (step == 0)
        fail("%s, line %d: t stands at %g: a line written twice, or t with too few digits", d->path, s->line[i], s->t[i]);
    if (step < 0)
        fail("%s, line %d: t goes back from %g to %g: a blank line belongs between two trajectories", d->path, s->line[i],
             s->t[i - 1], s->t[i]);
    if (2 * alike > length)
        fail("%s, line %d: trajectory %d has steps of %g s, most have %g s: one rate for all; resample it or leave it out", d->path,
             s->line[i], k + 1, step, dt);
    if (missing > 0.9 && fabs(missing - floor(missing + 0.5)) < 0.1)
        fail("%s, line %d: t grows by %g s, elsewhere by %g s, as if %.0f samples were missing: a blank line there makes two "
             "trajectories",
             d->path, s->line[i], step, dt, missing);
    fail("%s, line %d: t grows by %g s, elsewhere by %g s (%d of %d steps differ by more than 1 %%): samples at one rate are "
         "needed; resample, or write t with more digits",
         d->path, s->line[i], step, dt, off, steps);
}

/* All steps of t must be their median but for 1 %. dt is the first one where that is the median but for rounding, exact if t begins
   with 0, else their mean. */
static void check_time(motion *d, const sheet *s)
{
    double *step = room((size_t)d->samples, sizeof *step), first, mean = 0;
    int steps = 0, off = 0, at = 0, in = 0, k, i;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1]; i++)
            step[steps++] = s->t[i] - s->t[i - 1];
    if (steps == 0) fail("%s: no sample follows another one; a blank line stands between trajectories only", d->path);
    first = step[0];
    qsort(step, (size_t)steps, sizeof *step, smaller);
    d->dt = step[steps / 2];
    for (i = 0; i < steps; i++)
        mean += step[i] / steps;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1]; i++)
            if (!same_step(s->t[i] - s->t[i - 1], d->dt) && off++ == 0) at = i, in = k;
    if (off > 0) refuse_step(d, s, in, at, off, steps);
    d->dt = fabs(first - mean) <= 1e-6 * mean ? first : mean;
    if (d->dt < 1e-6 || d->dt > 1e6) fail("%s: steps of t are %g s; t is in seconds, from 1e-6 to 1e6 s apart", d->path, d->dt);
    free(step);
}

/* Encoders that begin anew every turn: a joint that is no angle, or an angle in degrees, that jumps by a turn in one sample. */
static void check_jumps(const motion *d, const sheet *s, unsigned angles)
{
    int k, i, j;
    for (j = 0; j < d->N; j++)
        for (k = 0; k < d->trajectories; k++)
            for (i = d->first[k] + 2; i < d->first[k + 1]; i++) {
                const roln_real *q = d->q + i * d->N + j;
                const double jump = fabs((double)(q[0] - q[-d->N])), before = fabs((double)(q[-d->N] - q[-2 * d->N]));
                const int angle = j < 32 && angles >> j & 1;
                const int radians = jump > 5.97 && jump < 6.29, degrees = jump > 342 && jump < 360.4;
                if (before > 0.05 * jump || !(degrees || (radians && !angle))) continue;
                fail("%s, line %d: q of joint %d jumps by %.4g, as an encoder that begins anew every turn: %s", d->path, s->line[i],
                     j + 1, jump, angle ? "in degrees, but angles are in radians" :
                     "ROLN_ANGLES is for a joint that turns round, in radians; else carry its turns on");
            }
}

/* Angles are carried on over whole turns: from sample to sample by the shorter way. */
static void unwrap(motion *d, unsigned angles)
{
    const double turn = 6.283185307179586;
    int k, i, j;
    for (j = 0; j < d->N; j++)
        for (k = 0; k < d->trajectories && angles >> j & 1; k++) {
            double turns = 0, last = (double)d->q[d->first[k] * d->N + j];
            for (i = d->first[k]; i < d->first[k + 1]; i++) {
                const double x = (double)d->q[i * d->N + j];
                turns -= floor((x - last) / turn + 0.5);
                last = x;
                d->q[i * d->N + j] = (roln_real)(x + turns * turn);
            }
        }
}

/* The first joint that goes over more than a turn and is no angle, or over many and is one. */
static void check_turns(const motion *d, unsigned angles)
{
    int i, j;
    for (j = 0; j < d->N; j++) {
        double low = (double)d->q[j], high = low;
        for (i = 1; i < d->samples; i++)
            low = fmin(low, (double)d->q[i * d->N + j]), high = fmax(high, (double)d->q[i * d->N + j]);
        if (high - low > 6.3 && !(j < 32 && angles >> j & 1)) {
            printf("warning: %s: q of joint %d goes from %.3g to %.3g; of a joint that turns round, ROLN_ANGLES learns that; "
                   "degrees make gains and torques those of degrees; of a slider nothing is wrong, but beside hinges it asks for "
                   "ROLN_SCALE each\n",
                   d->path, j + 1, low, high);
            return;
        }
        if (high - low > 130 && j < 32 && angles >> j & 1) {
            printf("warning: %s: q of joint %d, an angle, goes over %.0f turns; is it in radians?\n", d->path, j + 1,
                   (high - low) / 6.283185307179586);
            return;
        }
    }
}

/* ---- 4 velocities ---- */

/* Is one column the derivative of another one, x? Over pieces of a tenth of a second the change of x is the integral of dx/dt,
   however noisy or coarse x is. Correlation of both, their ratio, and the mean square of the change. */
typedef struct { double alike, scale, change; } likeness;

/* Column c of q.., qd.. */
static double column(const motion *d, int i, int c)
{
    return (double)(c < d->N ? d->q[i * d->N + c] : d->qd[i * d->N + c - d->N]);
}

static likeness compare(const motion *d, int x, int dx)
{
    const int tenth = d->dt < 0.1 ? (int)(0.1 / d->dt + 0.5) : 1;
    double xx = 0, vv = 0, xv = 0;
    likeness l = {0, 0, 0};
    int count = 0, k, i, j;
    for (k = 0; k < d->trajectories; k++) {
        const int quarter = (d->first[k + 1] - d->first[k]) / 4, most = tenth < quarter ? tenth : quarter;
        const int reach = most > 1 ? most : 1;
        for (i = d->first[k]; i + reach < d->first[k + 1]; i += reach, count++) {
            const double change = column(d, i + reach, x) - column(d, i, x);
            double sum = (column(d, i, dx) + column(d, i + reach, dx)) / 2;
            for (j = 1; j < reach; j++)
                sum += column(d, i + j, dx);
            sum *= d->dt;
            xx += change * change, vv += sum * sum, xv += change * sum;
        }
    }
    if (count > 0) l.change = xx / count;
    if (xx > 0 && vv > 0) l.alike = xv / sqrt(xx * vv), l.scale = sqrt(vv / xx);
    return l;
}

/* qd is not dq/dt: it looks otherwise, or is larger or smaller by more than what noise explains. */
static int differs(likeness l)
{
    return l.alike < 0.9 || l.scale > 1.1 / l.alike || l.scale < l.alike / 1.1;
}

static int about(double x, double value)
{
    return fabs(x / value - 1) < 0.03;
}

/* Nonzero if the columns go together as q1, qd1, q2, qd2 .. */
static int interleaved(const motion *d)
{
    int pairs = 0, j;
    for (j = 0; j < d->N; j++)
        pairs += compare(d, 2 * j, 2 * j + 1).alike > 0.9;
    return d->N > 1 && 2 * pairs > d->N;
}

/* The likely cause where qd of joint j, which moves, differs from dq/dt as l says. */
static const char *cause_of(const motion *d, int j, likeness l)
{
    const double degree = 3.14159265358979 / 180;
    int k;
    if (interleaved(d)) return "the columns look like q1, qd1, q2, qd2 ..; needed are all of q, then all of qd";
    if (l.scale == 0) return "it is 0 throughout";
    for (k = 0; k < d->N && l.alike < 0.9; k++)
        if (k != j && compare(d, j, d->N + k).alike > 0.95) return "that of another joint is: columns in another order?";
    if (l.alike < -0.9) return "it has the other sign";
    if (l.alike < 0.9) return "noise, another quantity (tau?), or columns in another order";
    if (about(l.scale, 1 / degree)) return "q is in radians, qd in degrees?";
    if (about(l.scale, degree)) return "q is in degrees, qd in radians?";
    if (about(l.scale, 1 / (6 * degree))) return "q is in radians, qd in revolutions per minute?";
    if (about(l.scale, 1000) || about(l.scale, 1e-3)) return "t in milliseconds, or q and qd in units a thousand apart?";
    return "another unit, or a gear between them?";
}

/* Roughness of qd of joint j, rms of its second differences over its own, if it is nothing but differences of q, and rough: those
   of an encoder, say. Else 0. */
static double raw_differences(const motion *d, int j)
{
    double square = 0, rough = 0, off[3] = {0, 0, 0};
    int k, i, kind;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1] - 1; i++) {
            const double a = column(d, i - 1, j), b = column(d, i, j), c = column(d, i + 1, j), v = column(d, i, d->N + j);
            const double of[] = {(b - a) / d->dt, (c - a) / (2 * d->dt), (c - b) / d->dt};
            const double bend = column(d, i + 1, d->N + j) - 2 * v + column(d, i - 1, d->N + j);
            square += v * v, rough += bend * bend;
            for (kind = 0; kind < 3; kind++)
                off[kind] += (v - of[kind]) * (v - of[kind]);
        }
    for (kind = 0; kind < 3; kind++)
        if (off[kind] <= 1e-6 * square && rough > 4e-4 * square) return sqrt(rough / square);
    return 0;
}

/* qd against dq/dt, of every joint that moves by a hundredth of what the most moving one does. */
static void check_velocities(motion *d, const wanted *w)
{
    likeness *l = room((size_t)d->N, sizeof *l);
    int moving = 0, zero = 0, wrong = 0, longer = 0, at = 0, widest = 0, j;
    for (j = 0; j < d->N; j++) {
        l[j] = compare(d, j, d->N + j);
        if (l[j].change > l[widest].change) widest = j;
    }
    for (j = 0; j < d->N; j++)
        if (l[j].change > 1e-4 * l[widest].change) {
            moving++, zero += l[j].scale == 0, longer += l[j].alike > 0.9 && (about(l[j].scale, 1e3) || about(l[j].scale, 1e6));
            if (differs(l[j]) && wrong++ == 0) at = j;
        }
    if (moving > 0 && zero == moving) {
        if (w->half == 0)
            fail("%s: qd is 0 throughout, but q moves; with smooth=10, say, qd comes from a parabola through 21 samples of q",
                 d->path);
        d->has_qd = 0;
    } else if (moving > 0 && longer == moving && d->dt >= 0.2) {
        fail("%s: t grows by %g a sample, and qd is %.0f times dq/dt: t is in %s; divide it by %s", d->path, d->dt, l[at].scale,
             l[at].scale < 1e4 ? "milliseconds" : "microseconds", l[at].scale < 1e4 ? "1000" : "1000000");
    } else if (wrong > 0 && (!w->qd_unused || interleaved(d))) {
        printf("warning: %s: qd of %d of %d joints that move is not dq/dt; of joint %d it is %.3g times that, with a correlation "
               "of %.2f: %s\n",
               d->path, wrong, moving, at + 1, l[at].scale, l[at].alike, cause_of(d, at, l[at]));
    } else if (moving > 0 && !w->qd_unused && raw_differences(d, widest) > 0) {
        printf("warning: %s: qd of joint %d is the differences of q, rough by %.0f %%; smooth=10, say, takes q, qd, qdd from a "
               "parabola through 21 samples of q\n",
               d->path, widest + 1, 100 * raw_differences(d, widest));
    }
    free(l);
}

/* ---- 5 noise, smoothing ---- */

/* dx = dx/dt by central differences inside each trajectory, one-sided at its ends. */
static void differences(const motion *d, const roln_real *x, roln_real *dx)
{
    const int N = d->N;
    int k, i, j;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k]; i < d->first[k + 1]; i++) {
            const int lo = i > d->first[k] ? i - 1 : i, hi = i + 1 < d->first[k + 1] ? i + 1 : i;
            for (j = 0; j < N && lo < hi; j++)
                dx[i * N + j] = (x[hi * N + j] - x[lo * N + j]) / (roln_real)((hi - lo) * d->dt);
        }
}

/* q += level rms(q - mean) normal, mean over the samples of each joint, rms over all samples and joints or, with each, of every
   joint by itself; then qd, qdd as an encoder without tachometer would give them. sd [N] out: the deviations of the noise. */
static void add_noise(motion *d, double level, int each, uint64_t seed, double *sd)
{
    const int N = d->N;
    double all = 0;
    int i, j;
    for (j = 0; j < N; j++) {
        double mean = 0, square = 0;
        for (i = 0; i < d->samples; i++)
            mean += (double)d->q[i * N + j] / d->samples;
        for (i = 0; i < d->samples; i++) {
            const double off = (double)d->q[i * N + j] - mean;
            square += off * off, all += off * off;
        }
        sd[j] = level * sqrt(square / d->samples);
    }
    for (j = 0; j < N && !each; j++)
        sd[j] = level * sqrt(all / d->samples / N);
    for (i = 0; i < d->samples * N; i++)
        d->q[i] += (roln_real)sd[i % N] * roln_normal(&seed);
    differences(d, d->q, d->qd);
    differences(d, d->qd, d->qdd);
}

/* Savitzky-Golay: q, qd, qdd of each sample from the least-squares parabola c0 + c1 x + c2 x^2 through q of the samples at
   x = -half .. half about it; at the ends of a trajectory from its first or last 2 half + 1 samples. */
static void smooth(motion *d, int half)
{
    const int N = d->N;
    const double dt = d->dt;
    double s0 = 2 * half + 1, s2 = 0, s4 = 0, det, *y = room((size_t)d->samples, sizeof *y);
    int k, i, j, x;
    for (x = -half; x <= half; x++)
        s2 += (double)x * x, s4 += (double)x * x * x * x;
    det = s0 * s4 - s2 * s2;
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], b = d->first[k + 1];
        if (b - a <= 2 * half)
            fail("smooth=%d needs %d samples, trajectory %d of %s has %d", half, 2 * half + 1, k + 1, d->path, b - a);
        for (j = 0; j < N; j++) {
            for (i = a; i < b; i++)
                y[i] = (double)d->q[i * N + j];
            for (i = a; i < b; i++) {
                const int mid = i < a + half ? a + half : i > b - 1 - half ? b - 1 - half : i;
                const double u = i - mid;
                double y0 = 0, y1 = 0, y2 = 0, c0, c1, c2;
                for (x = -half; x <= half; x++)
                    y0 += y[mid + x], y1 += x * y[mid + x], y2 += (double)x * x * y[mid + x];
                c0 = (s4 * y0 - s2 * y2) / det, c1 = y1 / s2, c2 = (s0 * y2 - s2 * y0) / det;
                d->q[i * N + j] = (roln_real)(c0 + u * (c1 + u * c2));
                d->qd[i * N + j] = (roln_real)((c1 + 2 * u * c2) / dt);
                d->qdd[i * N + j] = (roln_real)(2 * c2 / (dt * dt));
            }
        }
    }
    free(y);
}

/* ---- 6 a recording ---- */

/* Reads a file and checks it; qdd are the differences of qd. Without qd it has q alone, which has yet to be smoothed. */
static motion read_recording(const char *path, const wanted *w)
{
    motion d = {0};
    sheet s;
    int blank = 1, k, i;
    d.path = path, d.N = w->N, d.forces = w->inputs > 0 ? w->inputs : w->N;
    s = open_sheet(&d, w);
    while (next_line(path, &s)) {
        progress(path, (double)(s.row - 1) / s.lines);
        if (s.row == 1 && is_header(s.text)) {
            s.force = force_column(s.text);
            continue;
        }
        if (s.text[strspn(s.text, ", \t\r\n")] == 0) {
            blank = 1;
            continue;
        }
        if (blank) d.first[d.trajectories++] = d.samples;
        blank = 0;
        add_sample(&d, w, &s);
    }
    fclose(s.f);
    if (d.samples == 0) fail("%s has no samples", path);
    d.first[d.trajectories] = d.samples;
    check_time(&d, &s);
    check_jumps(&d, &s, w->angles);
    if (w->angles) unwrap(&d, w->angles);
    check_turns(&d, w->angles);
    if (d.has_qd) check_velocities(&d, w);
    if (d.dt >= 0.2) printf("warning: %s: samples are %g s apart; is t in seconds?\n", path, d.dt);
    differences(&d, d.qd, d.qdd);
    for (k = 0; k < d.trajectories; k++)
        for (i = d.first[k] * d.forces; i < d.first[k + 1] * d.forces; i++)
            d.tau_mid[i] = i < (d.first[k] + 1) * d.forces ? d.tau[i] : (d.tau[i - d.forces] + d.tau[i]) / 2;
    free(s.t), free(s.line), free(s.text), free(s.v);
    return d;
}

#endif
