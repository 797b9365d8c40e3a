/* SPDX-License-Identifier: MIT */
/* recording.h - recorded motion from CSV files, and what may be wrong with it: the one reader of train.c, range.c and
   tests/mujoco/convert.c.

   A line is a sample: the columns t, q.., qd.., tau..; qd is in units of q per second. A blank line stands between recordings; a
   header that is repeated begins one, too, and so does a t that starts again. tau is held from its sample to the next. For a model
   with a learned input map (ROLN_INPUTS) these columns are its inputs u. Columns may be left out: tau, and qd, which is then the
   derivative of q.

   columns  apart by semicolons, tabs, commas or blanks: one of them in a file, in this order of precedence. A comma may be the
            decimal mark if semicolons or tabs stand between columns. Empty columns at the end of a line count for nothing
   numbers  those of C, also 1.5D+00, in quotes or not; not nan, not infinite, no marks between thousands
   t        seconds; other units if the header or a row of units below it says so: t_ms, time [us], "ms;deg;deg"; also seconds,
            milliseconds, microseconds or nanoseconds since 1970; date and time of ISO 8601, or hh:mm:ss
   header   one name a column, or none; lines of text before it, whose first piece is no number and no time, and lines that begin
            with #, % or //, are not read. A name that contradicts the order of columns, or that of joints, is refused
   bytes    ASCII or UTF-8, lines that end with LF, CR LF or CR

   A column map takes columns in another order, with units and gains: q=2:7,deg tau=14:19,A*14.9 t=1 (`wanted`). Columns that it
   does not name may hold anything; rows that lack a number or a cell are left out; tau is the force at the time of its sample.

   Names and units of a file are compared with those of the first one. A last row that is cut off is left out.

   Steps of t that differ by more than 1 % are brought to one rate by local cubics (resample.h), and gaps split recordings. If the
   spectrum shows noise, q, qd and tau pass the same filter without phase. Recordings of even steps and without noise stay as they
   are, to the bit. Every change is told.

   For a joint that the model takes for an angle (ROLN_ANGLES), q may jump by turns: it is read without them.

   What would make a training useless ends the program with FILE:LINE, what is wrong, and a hint what to do. What may be meant is a
   warning: qd that is not dq/dt, with the likely cause; a joint that goes over more than a turn, and is no angle of the model.

   1 messages     2 pieces of a line     3 time     4 names     5 samples     6 column map     7 time stamps     8 velocities
   9 one rate, one filter     10 noise, smoothing     11 recordings */

#ifndef RECORDING_H
#define RECORDING_H

#include "roln_spd.h"
#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "resample.h"

enum { OF_T, OF_Q, OF_QD, OF_TAU, KINDS };

/* A column that is used, as the table of columns prints it. */
typedef struct {
    int kind, index, column; /* index: joint or motor, from 0; column: from 1, 0: none */
    const char *name;
    char unit[24], foreign[24]; /* foreign: a unit that the file names and nobody knows */
    double factor; /* of the number in the file, to rad, s, Nm .. */
    double noise;  /* deviation of the white noise that the spectrum shows before any filter, in rad, Nm ..; 0: none */
    double share;  /* of noise in what the trainer needs of the column: qdd, or tau */
    double most;   /* of |tau| as it was read, without wild samples, before any filter; in the unit of the motion */
} field;

typedef struct {
    const char *path;                  /* the file, or how many there are */
    int N, forces;                     /* columns q; columns tau or u */
    int trajectories, samples, *first; /* first [trajectories + 1] */
    int has_qd, has_tau, qd_derived; /* qd_derived: qd is the derivative of q */
    double dt;
    roln_real *q, *qd, *qdd;  /* [samples][N] */
    roln_real *tau, *tau_mid; /* [samples][forces]: the mean force up to the next sample; the force that belongs to qdd */
    const char **file;        /* [trajectories] */
    double *t, *origin;       /* [samples], in s, less origin [trajectories] */
    int *line;                /* [samples]; the line in its file */
    field *fields;            /* of the first file */
    int count;                /* of fields */
    double tau_unit;          /* of tau, in that of the recordings; 0: the same, or no torque yet that is not 0 */
    int measured;             /* nonzero: tau is the force at the time of its sample; 0: it is held up to the next sample */
    int mapped, clock;        /* nonzero: there is a column map; t is a time of the day */
    double unit;              /* of t, in s */
    int guessed;              /* nonzero: it follows from the size of t alone */
    char foreign[24];         /* a unit of t that the last file names and nobody knows */
    char noted[24];           /* without a column map: the last file's first unit that would change numbers; empty: none */
    const char *in_unit, *in_none; /* the first file that says a unit of t other than s; that says none */
    double reach;             /* s on each side that the filter sees; 0: no filter */
    double kernel;            /* s on each side of the local cubics of resampling, which lessen noise; 0: there were none */
    int kept;                 /* nonzero: they made but the samples that were missing, and forces that are held */
    int left_out, short_left; /* rows without a number; samples between gaps that are too close */
    int lost;                 /* of those rows: with fewer cells than columns */
    int gaps, filled;         /* of resampling: where recordings were split; samples that were missing */
    double apart;             /* s of those gaps */
} motion;

/* What a model asks of a file. */
typedef struct {
    const char *model;
    int N, inputs;   /* inputs of a learned input map, 0: none */
    int torque;      /* nonzero: tau is needed */
    int driven;      /* nonzero: some joints are driven, so the torques of the others may be 0 */
    int own_unit;    /* nonzero: tau in a unit that follows from its size: Nm, mNm and lbf ft become the same bits */
    int half;        /* samples on each side that positions are smoothed over, 0: not */
    int qd_unused;   /* nonzero: q alone is used */
    unsigned angles; /* bit j: joint j is an angle in radians */
    int each;        /* nonzero: each joint has a unit of its own */
    const char *columns[KINDS]; /* t=, q=, qd=, tau=: which columns; NULL: nothing said, and without q= the order t, q, qd, tau */
    double dt;                  /* s from sample to sample; 0: that of the recordings */
    double filter;              /* Hz; 0: what the spectrum asks for; below 0: none */
    int tell;                   /* nonzero: print the table of columns */
    const motion *like;         /* names and units of columns are compared with those of its first file; NULL: they are the first */
} wanted;

/* ---- 1 messages ---- */

#ifndef SILENT
#define SILENT 10 /* s without a word, at most */
#endif

enum { DONE, WRONG, LOST }; /* exit codes: what the user can mend; a training that came to nothing */

static void (*before_end)(int code); /* called before the last message, with the exit code; NULL: no call */

static void end_with(int code, const char *format, va_list list)
{
    if (before_end) before_end(code);
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

/* All that was said of recordings, for a report; what has no room is left out. */
static char transcript[1 << 16];

static int quiet; /* nonzero: `say` writes into the transcript alone */

/* Says something of recordings. */
static void say(const char *format, ...)
{
    const size_t at = strlen(transcript);
    va_list list;
    va_start(list, format);
    if (!quiet) vprintf(format, list);
    va_end(list);
    va_start(list, format);
    vsnprintf(transcript + at, sizeof transcript - at, format, list);
    va_end(list);
}

/* Seconds from some instant on; with NO_THREADS those of clock(), which on other systems than Windows the processor worked. */
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
    if (!p)
        fail("out of memory: %.0f times %.0f bytes\nhint: fewer or shorter recordings, or a smaller model", (double)count,
             (double)size);
    return p;
}

/* ---- 2 pieces of a line ---- */

/* The text between two separators, without blanks and quotes around it. */
typedef struct {
    const char *at;
    int n;
} piece;

/* A byte of a text as it is printed. */
static char printable(char c)
{
    return (char)((unsigned char)c < 32 || c == 127 ? '?' : c);
}

/* Writes n bytes of text to `to`, without control characters. Of more than `most` bytes the middle is left out, in whole letters:
   names differ at both ends. */
static void put_short(char *to, const char *at, int n, int most)
{
    int head = n, tail = n;
    if (n > most)
        for (head = most / 2 - 1, tail = n - (most - 2 - head); head > 0 && ((unsigned char)at[head] & 0xc0) == 0x80;)
            head--;
    while (tail < n && ((unsigned char)at[tail] & 0xc0) == 0x80)
        tail++;
    snprintf(to, (size_t)most + 1, "%.*s%s%.*s", head, n > 0 ? at : "", head < n ? ".." : "", n - tail, n > 0 ? at + tail : "");
    for (; *to; to++)
        *to = printable(*to);
}

/* A piece as a message quotes it. Two at a time. */
static const char *quoted(piece w)
{
    static char text[2][48];
    static int which;
    char *to = text[which = !which];
    put_short(to, w.at, w.n, 42);
    return to;
}

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* What stands between the columns of a line: a semicolon; else a tab, if every comma stands between two digits, as a decimal one
   does; else a comma; else ' ', blanks and tabs. */
static char separator_of(const char *line)
{
    int tab = 0, comma = 0, decimal = 1;
    const char *p, *close;
    for (p = line; *p; p++) {
        if (*p == '"' && (close = strchr(p + 1, '"')) != NULL) p = close;
        if (*p == ';') return ';';
        tab |= *p == '\t';
        if (*p == ',') comma = 1, decimal &= p > line && is_digit(p[-1]) && is_digit(p[1]);
    }
    return tab && decimal ? '\t' : comma ? ',' : ' ';
}

/* Nonzero if a date begins there: 2026-11-25. */
static int is_date(const char *p)
{
    static const char form[] = "dddd-dd-dd";
    int i;
    for (i = 0; form[i]; i++)
        if (form[i] == 'd' ? !is_digit(p[i]) : p[i] != form[i]) return 0;
    return 1;
}

/* The end of the piece that begins at p, the first one of its line or not: at its separator, or the end of the line. */
static const char *end_of_piece(char apart, const char *p, int first)
{
    const char set[] = {apart, (char)(apart == ' ' ? '\t' : 0), 0};
    const char *close = *p == '"' || *p == '\'' ? strchr(p + 1, *p) : NULL, *after;
    if (close) {
        after = close + 1 + strspn(close + 1, apart == '\t' ? " " : " \t");
        if (*after == 0 || *after == apart || (apart == ' ' && after > close + 1)) return after;
    }
    if (first && apart == ' ' && is_date(p) && p[10] == ' ' && is_digit(p[11]) && is_digit(p[12]) && p[13] == ':') p += 11;
    return p + strcspn(p, set);
}

/* The pieces of a line, the first `most` of them into w. Returns how many there are, without empty ones at the end; *cells: with
   them. Between blanks no piece is empty. */
static int split_cells(char apart, const char *p, int most, piece *w, int *cells)
{
    const char *const blanks = apart == '\t' ? " " : " \t";
    int count = 0, full = 0, open = 0; /* open: a separator came last */
    for (p += strspn(p, blanks); *p; p += strspn(p, blanks)) {
        const char *const end = end_of_piece(apart, p, count == 0);
        piece x;
        x.at = p, x.n = (int)(end - p);
        while (x.n > 0 && strchr(blanks, x.at[x.n - 1]))
            x.n--;
        if (x.n > 1 && (*p == '"' || *p == '\'') && x.at[x.n - 1] == *p) x.at++, x.n -= 2;
        while (x.n > 0 && *x.at == ' ')
            x.at++, x.n--;
        while (x.n > 0 && x.at[x.n - 1] == ' ')
            x.n--;
        if (count < most) w[count] = x;
        count++;
        if (x.n > 0) full = count;
        open = *end == apart && apart != ' ';
        p = end + open;
    }
    *cells = count + open;
    return full;
}

static int split(char apart, const char *p, int most, piece *w)
{
    int cells;
    return split_cells(apart, p, most, w, &cells);
}

/* Nonzero if a piece is a number, finite or not: *x. Beside those of C: a decimal comma, where commas do not stand between columns,
   and D for the exponent, as Fortran writes it. */
static int number(char apart, piece w, double *x)
{
    char text[128], *end;
    int hex = 0, i;
    if (w.n == 0 || w.n >= (int)sizeof text || isspace((unsigned char)*w.at)) return 0;
    for (i = 0; i < w.n; i++) {
        const char c = w.at[i], before = (char)(i > 0 ? w.at[i - 1] : 0);
        hex |= c == 'x' || c == 'X';
        text[i] = c;
        if (c == ',' && (apart == ';' || apart == '\t')) text[i] = '.';
        if ((c == 'd' || c == 'D') && !hex && (is_digit(before) || before == '.' || before == ',')) text[i] = 'e';
    }
    text[w.n] = 0;
    *x = strtod(text, &end);
    return end == text + w.n;
}

/* Nonzero if a piece is a number, or begins like one, behind a quote that stays open or not: no name. */
static int is_numeric(char apart, piece w)
{
    const char *p = w.at;
    double x;
    if (w.n == 0) return 0;
    p += strspn(p, " \"'");
    p += *p == '+' || *p == '-';
    return is_digit(p[*p == '.' || *p == ',']) || number(apart, w, &x);
}

/* ---- 3 time ---- */

/* A time stamp: `whole` + `rest`, in units of t, so that long ones keep their digits. */
typedef struct {
    enum { NUMBER, DATE, ZONED, CLOCK } kind; /* ZONED: a date and time with a zone; CLOCK: hh:mm:ss */
    long long whole;
    double rest;
} stamp;

/* Two digits at *p, from 0 to `most`; -1: there are none. */
static int two_digits(const char **p, int most)
{
    const char *d = *p;
    const int x = is_digit(d[0]) && is_digit(d[1]) ? 10 * (d[0] - '0') + d[1] - '0' : -1;
    if (x < 0 || x > most) return -1;
    *p += 2;
    return x;
}

/* Adds hh:mm[:ss[.fff]] at *p, before `end`, to a stamp. Returns the parts that were read, 2 or 3; 0: it is none. */
static int read_clock(const char **p, const char *end, stamp *t)
{
    const int h = two_digits(p, 23), colon = h >= 0 && **p == ':', m = colon ? (++*p, two_digits(p, 59)) : -1;
    int s;
    if (m < 0) return 0;
    t->whole += 3600 * h + 60 * m;
    if (**p != ':') return 2;
    ++*p;
    if ((s = two_digits(p, 60)) < 0) return 0; /* 60: a leap second */
    t->whole += s;
    if (*p < end && (**p == '.' || **p == ',')) {
        double digits = 0, scale = 1;
        for (++*p; is_digit(**p); ++*p)
            if (scale < 1e15) digits = 10 * digits + (**p - '0'), scale *= 10;
        t->rest = digits / scale;
    }
    return 3;
}

/* Takes the zone at *p, if there is one, from a stamp: Z, +hh, +hhmm, +hh:mm. Returns 0 if it is none. */
static int read_zone(const char **p, stamp *t)
{
    const int sign = **p == '+' ? 1 : -1;
    int h, m = 0;
    if (**p != 'Z' && **p != 'z' && **p != '+' && **p != '-') return 1;
    t->kind = ZONED;
    if (*(*p)++ == 'Z' || (*p)[-1] == 'z') return 1;
    if ((h = two_digits(p, 23)) < 0) return 0;
    *p += **p == ':';
    if (is_digit(**p) && (m = two_digits(p, 59)) < 0) return 0;
    t->whole -= sign * (3600 * h + 60 * m);
    return 1;
}

/* A date of ISO 8601, alone or with a time behind T or a blank; or a time of the day. Returns 0 if the piece is neither. */
static int read_date(piece w, stamp *t)
{
    static const int days[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    const char *p = w.at, *const end = w.at + w.n;
    if (is_date(p)) {
        const int y = 1000 * (p[0] - '0') + 100 * (p[1] - '0') + 10 * (p[2] - '0') + p[3] - '0';
        const int month = 10 * (p[5] - '0') + p[6] - '0', day = 10 * (p[8] - '0') + p[9] - '0';
        const int leap = y % 4 == 0 && (y % 100 != 0 || y % 400 == 0);
        const int from_march = (month + 9) % 12, year = y - (month < 3); /* years that begin in March */
        if (y < 1 || month < 1 || month > 12 || day < 1 || day > days[month - 1] + (month == 2 && leap)) return 0;
        t->kind = DATE;
        t->whole = 86400LL * (365LL * year + year / 4 - year / 100 + year / 400 + (153 * from_march + 2) / 5 + day - 719469);
        p += 10;
        if (p < end && (*p == 'T' || *p == 't' || *p == ' ') && (++p, read_clock(&p, end, t) == 0 || !read_zone(&p, t))) return 0;
    } else {
        t->kind = CLOCK;
        if (read_clock(&p, end, t) != 3) return 0;
    }
    return p == end;
}

/* The time stamp of a sample. Returns 0 if it is none. */
static int read_stamp(char apart, piece w, stamp *t)
{
    int n = 0;
    t->whole = 0, t->rest = 0;
    if (read_date(w, t)) return 1;
    t->kind = NUMBER, t->whole = 0;
    if (!number(apart, w, &t->rest) || !(fabs(t->rest) < 3e38)) return 0;
    while (n < w.n && is_digit(w.at[n]))
        n++;
    if (n >= 9 && (n < 19 || (n == 19 && *w.at < '9')) && (n == w.n || w.at[n] == '.' || w.at[n] == ',')) {
        char text[128] = "0."; /* digits, and perhaps a decimal mark and more of them: an exponent would be in the way */
        int i;
        for (i = n + 1; i < w.n; i++)
            if (!is_digit(w.at[i])) return 1;
        for (i = 0; i < n; i++)
            t->whole = 10 * t->whole + (w.at[i] - '0');
        if (n + 1 < w.n) memcpy(text + 2, w.at + n + 1, (size_t)(w.n - n - 1));
        t->rest = strtod(text, NULL);
    }
    return 1;
}

/* Seconds of a unit of time; 0: it is none. */
static double unit_of(piece w)
{
    static const struct {
        const char *name;
        double s;
    } units[] = {{"s", 1}, {"sec", 1}, {"secs", 1}, {"second", 1}, {"seconds", 1}, {"ms", 1e-3}, {"msec", 1e-3}, {"msecs", 1e-3},
                 {"millis", 1e-3}, {"milliseconds", 1e-3}, {"us", 1e-6}, {"usec", 1e-6}, {"usecs", 1e-6}, {"micros", 1e-6},
                 {"microseconds", 1e-6}, {"\xc2\xb5s", 1e-6}, {"\xce\xbcs", 1e-6}, {"ns", 1e-9}, {"nsec", 1e-9}, {"nsecs", 1e-9},
                 {"nanos", 1e-9}, {"nanoseconds", 1e-9}, {"min", 60}, {"minutes", 60}, {"h", 3600}, {"hours", 3600}};
    size_t i;
    if (w.n > 2 && (*w.at == '[' || *w.at == '(') && strchr("])", w.at[w.n - 1])) w.at++, w.n -= 2;
    for (i = 0; i < sizeof units / sizeof *units; i++)
        if (w.n == (int)strlen(units[i].name) && strncmp(w.at, units[i].name, (size_t)w.n) == 0) return units[i].s;
    return 0;
}

/* Units, for each kind of column: what one of them is in s, rad or m, rad/s or m/s, Nm or N. per: a number of them must follow, as
   in counts/4096, and makes a turn. The first one of a kind is what a column has if nobody says anything. */
static const struct {
    int kind, per;
    const char *name;
    double factor;
    const char *si;
} known_units[] = {{OF_Q, 0, "rad", 1, "rad"},
                   {OF_Q, 0, "deg", 0.017453292519943295, "rad"},
                   {OF_Q, 0, "\xc2\xb0", 0.017453292519943295, "rad"},
                   {OF_Q, 0, "turns", 6.283185307179586, "rad"},
                   {OF_Q, 0, "turn", 6.283185307179586, "rad"},
                   {OF_Q, 0, "rev", 6.283185307179586, "rad"},
                   {OF_Q, 0, "m", 1, "m"},
                   {OF_Q, 0, "cm", 1e-2, "m"},
                   {OF_Q, 0, "mm", 1e-3, "m"},
                   {OF_Q, 1, "counts", 6.283185307179586, "rad"},
                   {OF_Q, 0, "raw", 1, "as it is"},
                   {OF_QD, 0, "rad/s", 1, "rad/s"},
                   {OF_QD, 0, "deg/s", 0.017453292519943295, "rad/s"},
                   {OF_QD, 0, "\xc2\xb0/s", 0.017453292519943295, "rad/s"},
                   {OF_QD, 0, "rpm", 0.10471975511965977, "rad/s"},
                   {OF_QD, 0, "turns/s", 6.283185307179586, "rad/s"},
                   {OF_QD, 0, "rev/s", 6.283185307179586, "rad/s"},
                   {OF_QD, 0, "m/s", 1, "m/s"},
                   {OF_QD, 0, "cm/s", 1e-2, "m/s"},
                   {OF_QD, 0, "mm/s", 1e-3, "m/s"},
                   {OF_QD, 1, "counts/s", 6.283185307179586, "rad/s"},
                   {OF_QD, 0, "raw", 1, "as it is"},
                   {OF_TAU, 0, "Nm", 1, "Nm"},
                   {OF_TAU, 0, "mNm", 1e-3, "Nm"},
                   {OF_TAU, 0, "kNm", 1e3, "Nm"},
                   {OF_TAU, 0, "Ncm", 1e-2, "Nm"},
                   {OF_TAU, 0, "N", 1, "N"},
                   {OF_TAU, 0, "mN", 1e-3, "N"},
                   {OF_TAU, 0, "kN", 1e3, "N"},
                   {OF_TAU, 0, "A", 1, "A"},
                   {OF_TAU, 0, "mA", 1e-3, "A"},
                   {OF_TAU, 0, "raw", 1, "as it is"}};
enum { UNITS = sizeof known_units / sizeof *known_units };

/* The unit of a kind that a text begins with, the longest; -1: none. A number must follow it, behind * or /, or nothing. */
static int find_unit(int kind, const char *text, int n)
{
    int best = -1, longest = 0, i;
    for (i = 0; i < UNITS; i++) {
        const int m = (int)strlen(known_units[i].name);
        if (known_units[i].kind != kind || m <= longest || m > n || strncmp(text, known_units[i].name, (size_t)m) != 0) continue;
        if (m < n && text[m] != '*' && text[m] != '/') continue;
        best = i, longest = m;
    }
    return best;
}

/* The unit of a kind that a name ends with behind _, if its numbers are not in rad, m, Nm ..: q1_deg, v_deg_s; -1: none. */
static int unit_ending(int kind, piece name)
{
    int best = -1, longest = 0, i, k;
    for (i = 0; i < UNITS; i++) {
        const char *const unit = known_units[i].name;
        const int n = (int)strlen(unit), from = name.n - n;
        if (known_units[i].kind != kind || known_units[i].per || known_units[i].factor == 1 || n <= longest) continue;
        if (from < 2 || name.at[from - 1] != '_') continue;
        for (k = 0; k < n && (name.at[from + k] == unit[k] || (unit[k] == '/' && name.at[from + k] == '_'));)
            k++;
        if (k == n) best = i, longest = n;
    }
    return best;
}

/* Nonzero if it is a unit of a coordinate, velocity or torque other than rad, m, Nm .. */
static int is_other_unit(piece w)
{
    int kind;
    for (kind = OF_Q; kind <= OF_TAU; kind++) {
        const int i = w.n > 0 ? find_unit(kind, w.at, w.n) : -1;
        if (i >= 0 && (int)strlen(known_units[i].name) == w.n && known_units[i].factor != 1) return 1;
    }
    return 0;
}

/* The unit in brackets at the end of a name; empty: none. */
static piece in_brackets(piece name)
{
    piece unit = {NULL, 0};
    int i = name.n;
    while (i > 0 && !strchr("[(", name.at[i - 1]))
        i--;
    if (i > 0 && strchr("])", name.at[name.n - 1])) unit.at = name.at + i, unit.n = name.n - 1 - i;
    return unit;
}

/* The unit that the name of t ends with: ms, t_ms, time [ms], t(ms), t/ms; 0: none. */
static double unit_in(piece w)
{
    piece end = w;
    int i;
    for (i = 0; i < w.n; i++)
        if (strchr("_[( /.", w.at[i]) && i + 1 < w.n) end.at = w.at + i + 1, end.n = w.n - i - 1;
    while (end.n > 0 && strchr("]) ", end.at[end.n - 1]))
        end.n--;
    return unit_of(end);
}

/* ---- 4 names ---- */

/* A file that is being read: time and line of each sample, and a line of text. */
typedef struct {
    FILE *f;
    int lines, row, columns; /* lines of the file; the line that was read last, its columns */
    int cut;                 /* nonzero: the line has no end, so it is the last one, and perhaps cut off */
    int cells;               /* with a column map: of the first sample, with empty ones at its end */
    int behind;              /* the first column behind the last that is used that has held a number; 0: none */
    int *line, size;         /* size of text and of header */
    char apart, mark;        /* between columns; in numbers: a point or a comma; 0: none yet */
    int kind;                /* of time stamps */
    long long zero;          /* what is taken from all of them */
    double unit;             /* of t, in s; 0: nothing said */
    int guessed;             /* nonzero: it follows from the size of t alone */
    int unit_said;           /* nonzero: the file or the map says it */
    int header_row, comment; /* where the header stands, 0: none; nonzero: in a comment */
    int named, separators;   /* nonzero: the header names the columns; lines of separators alone */
    int most, taken;         /* room for columns; samples of this file so far */
    int rows;                /* with those that are left out */
    int used[KINDS], *column[KINDS], last; /* with a column map: columns of each kind, from 1; the last one */
    double *factor[KINDS];
    int again;         /* nonzero: the header was repeated, and neither its units nor a sample have come since */
    const wanted *map; /* NULL: no column map */
    int by_number;     /* nonzero: the map has no names */
    int first_file;
    double *v;
    piece *w, *name; /* of the line; of the header */
    char *text, *header, *units; /* units: the row of units below the header */
    int units_row;
} sheet;

/* Nonzero if a name begins with a stem, in letters of either kind. */
static int begins(piece w, const char *stem)
{
    int i;
    for (i = 0; stem[i]; i++)
        if (i >= w.n || tolower((unsigned char)w.at[i]) != stem[i]) return 0;
    return 1;
}

/* Nonzero if a name is the stem, or goes on with a digit, _ or [. */
static int is_called(piece w, const char *stem)
{
    const int n = (int)strlen(stem);
    return begins(w, stem) && (w.n == n || is_digit(w.at[n]) || w.at[n] == '_' || w.at[n] == '[');
}

/* Nonzero if a name is the stem, alone or with a number: q, q1, q_1, q[1], the latter with a unit behind it or not. */
static int is_numbered(piece w, const char *stem)
{
    int n = (int)strlen(stem);
    if (!begins(w, stem)) return 0;
    if (w.n == n) return 1;
    n += w.at[n] == '_' || w.at[n] == '[';
    if (n >= w.n || !is_digit(w.at[n])) return 0;
    while (n < w.n && is_digit(w.at[n]))
        n++;
    return n == w.n || strchr("] ([", w.at[n]) != NULL;
}

/* Nonzero if a name may be that of t. */
static int is_time(piece w)
{
    int i;
    if (begins(w, "t") && (w.n == 1 || !isalpha((unsigned char)w.at[1]))) return 1;
    for (i = 0; i < w.n; i++) {
        piece rest;
        rest.at = w.at + i, rest.n = w.n - i;
        if (begins(rest, "time") || begins(rest, "stamp")) return 1;
    }
    return unit_of(w) > 0;
}

/* Nonzero if a line of names may be a header: the first name is t, or another name is a position, velocity or force. */
static int is_header(const piece *name, int names)
{
    int i;
    for (i = 0; i < names; i++)
        if (i == 0 ? is_time(name[i]) : is_numbered(name[i], "q") || is_numbered(name[i], "qd") || is_numbered(name[i], "tau"))
            return 1;
    return 0;
}

/* The names of `columns` columns, of the header. Returns how many there are: 0 if there is no header, or a comment or another
   line of text that is none. */
static int read_names(const motion *d, sheet *s, int columns, int most)
{
    const char *text = s->header;
    int names, i, j;
    if (s->header_row == 0) return 0;
    if (s->comment) text += strspn(text, " \t#%/");
    names = split(strchr(text, s->apart) ? s->apart : separator_of(text), text, most, s->name);
    if (s->comment && (names != columns || !is_time(s->name[0]))) return 0;
    if (names != columns && !is_header(s->name, names < most ? names : most)) {
        say("%s:%d: text, not a header: line %d has another number of columns\n", d->path, s->header_row, s->row);
        return s->header_row = 0;
    }
    for (i = 1; i < names && i < most && names == columns && !is_time(s->name[0]); i++)
        if (is_numeric(s->apart, s->name[i]))
            fail("%s:%d: column 1: expected a time, found \"%s\"\nhint: seconds, or like 2026-11-25T18:10:05.25; the name of t, if "
                 "this "
                 "is a header",
                 d->path, s->header_row, quoted(s->name[0]));
    if (names != columns)
        fail("%s:%d: %d names, but %d columns in line %d\nhint: one name a column, apart as the numbers are; or remove the header",
             d->path, s->header_row, names, columns, s->row);
    for (i = 0; i < names && i < most && unit_of(s->name[0]) <= 0; i++) /* a row of units repeats itself */
        for (j = 0; j < i; j++)
            if (s->name[i].n > 0 && s->name[i].n == s->name[j].n && memcmp(s->name[i].at, s->name[j].at, (size_t)s->name[i].n) == 0)
                fail("%s:%d: columns %d and %d are both called \"%s\"\nhint: give each column a name of its own, or remove the "
                     "header",
                     d->path, s->header_row, j + 1, i + 1, quoted(s->name[i]));
    return names;
}

/* The column from which on all are called tau or u, from 0; 0: the last one is not. */
static int force_column(const sheet *s, int names)
{
    int c = names;
    while (c > 1 && (is_called(s->name[c - 1], "tau") || is_called(s->name[c - 1], "u")))
        c--;
    return c < names ? c : 0;
}

/* What n columns are: 1 + N positions, 1 + 2 N with velocities, then forces, or with an input map 1 + N and inputs; as many forces
   as velocities would be are forces if a header says so, in column `named`. */
static void columns_are(motion *d, const wanted *w, int row, int n, int named)
{
    const char *const force = w->inputs > 0 ? "u" : "tau";
    const int N = w->N, F = d->forces, ambiguous = F == N && named != 1 + N;
    d->has_qd = n == 1 + 2 * N + F || (n == 1 + 2 * N && (F != N || ambiguous));
    d->has_tau = n == 1 + 2 * N + F || (!ambiguous && n == 1 + N + F);
    if (!d->has_qd && !d->has_tau && n != 1 + N)
        fail(
            "%s:%d: %d columns, but %s needs t, %d q, %d qd: %d, or with %d %s %d; of positions alone %d\nhint: take other columns "
            "out, or train a model of other sizes",
            d->path, row, n, w->model, N, N, 1 + 2 * N, F, force, 1 + 2 * N + F, 1 + N);
    if (!d->has_tau && w->torque)
        fail("%s:%d: no %s columns, which torque=1 needs\nhint: %s", d->path, row, force,
             ambiguous && n == 1 + 2 * N
                 ? "without qd, a header says where they are: t,q1,..,tau1,.., or a column map: q=2:3 tau=4:5"
                 : "record them, or leave torque=1 out");
}

/* The number in a name such as q1, tau_2, qd[3]; -1: there is none. */
static int number_in(piece w)
{
    int i = 0, x = 0;
    while (i < w.n && !is_digit(w.at[i]))
        i++;
    if (i == w.n) return -1;
    while (i < w.n && is_digit(w.at[i]) && x < 100000)
        x = 10 * x + w.at[i++] - '0';
    return x;
}

/* Refuses a header that says q1, qd1, tau1 of columns that are something else, or joints in another order. */
static void check_names(const motion *d, const sheet *s, int names)
{
    static const char *const kinds[] = {"t", "q", "qd", "tau"};
    int before = -1, kind = 0, c;
    for (c = 0; c < names; c++) {
        const piece w = s->name[c];
        const int is = c == 0 ? 0 : c <= d->N ? 1 : c <= 2 * d->N && d->has_qd ? 2 : 3;
        const int says = is_numbered(w, "q")                            ? 1
                         : is_numbered(w, "qd") || is_numbered(w, "dq") ? 2
                         : is_numbered(w, "tau")                        ? 3
                                                                        : is;
        if (says != is)
            fail(
                "%s:%d: column %d is called \"%s\", but stands where %s is expected\nhint: the order is t, all q, all qd, all tau; "
                "the model has %d joints",
                d->path, s->header_row, c + 1, quoted(w), kinds[is], d->N);
        if (is != kind) before = -1, kind = is;
        if (c == 0 || !(is_numbered(w, kinds[is]) || is_numbered(w, is == 2 ? "dq" : "u"))) continue;
        if (number_in(w) >= 0 && number_in(w) <= before)
            fail("%s:%d: column %d is called \"%s\", but stands behind \"%s\"\nhint: joints in the same order in q, qd and tau; a "
                 "column map takes any order: q=2:3, or by names",
                 d->path, s->header_row, c + 1, quoted(w), quoted(s->name[c - 1]));
        before = number_in(w);
    }
}

/* ---- 5 samples ---- */

/* Reads text up to the end of its line, LF, CR LF or CR, which becomes LF, or as much as there is room for. Returns how many bytes;
   0 at the end of the file. */
static int read_text(sheet *s)
{
    int n = 0, c = 0;
    while (n < s->size - 1 && c != '\n' && (c = getc(s->f)) != EOF) {
        if (c == '\r') {
            if ((c = getc(s->f)) != '\n' && c != EOF) ungetc(c, s->f);
            c = '\n';
        }
        s->text[n++] = (char)c;
    }
    s->text[n] = 0;
    return n;
}

/* Room for `count` things, the first `used` of which are those of *p. */
static void *extended(void *p, size_t used, size_t count, size_t size)
{
    void *to = room(count, size);
    if (used > 0) memcpy(to, p, used * size);
    free(p);
    return to;
}

/* Room for `lines` more samples, and as many recordings. */
static void make_room(motion *d, int lines)
{
    const size_t row = (size_t)d->N * sizeof(roln_real), had = (size_t)d->samples, all = had + (size_t)lines + 1;
    const size_t forces = (size_t)d->forces * sizeof(roln_real), parts = (size_t)d->trajectories;
    d->q = extended(d->q, had, all, row), d->qd = extended(d->qd, had, all, row);
    d->tau = extended(d->tau, had, all, forces > row ? forces : row);
    d->first = extended(d->first, parts, all, sizeof *d->first);
    d->file = extended(d->file, parts, all, sizeof *d->file), d->origin = extended(d->origin, parts, all, sizeof *d->origin);
    d->t = extended(d->t, had, all, sizeof *d->t), d->line = extended(d->line, had, all, sizeof *d->line);
}

/* Opens a file, counts its lines, and makes room for as many samples. */
static sheet open_sheet(motion *d, const wanted *w)
{
    const size_t mapped = w->columns[OF_Q] ? 32768 : 0;
    sheet s = {0};
    size_t lines;
    s.size = (mapped ? 1 << 20 : 65536) + 64 * (1 + 3 * w->N), s.most = mapped ? (int)mapped : 2 + 3 * w->N;
    s.text = room((size_t)s.size, 1), s.header = room((size_t)s.size, 1), s.v = room((size_t)s.most, sizeof *s.v);
    s.w = room((size_t)s.most, sizeof *s.w), s.name = room((size_t)s.most, sizeof *s.name);
    s.units = room((size_t)s.size, 1), s.map = mapped ? w : NULL;
    s.f = fopen(d->path, "rb");
    if (!s.f) fail("cannot read %s: %s\nhint: check the path", d->path, strerror(errno));
    while (read_text(&s))
        if (s.lines++ == INT_MAX - 1) fail("%s has more than 2^31 lines\nhint: leave recordings out", d->path);
    if (ferror(s.f)) fail("cannot read %s: %s\nhint: name a file, or copy it to another place first", d->path, strerror(errno));
    rewind(s.f);
    if (s.lines == 0) fail("%s is empty\nhint: a CSV has the columns t, q.., qd.., tau..", d->path);
    lines = (size_t)s.lines + (size_t)d->samples;
    if (lines >= (size_t)INT_MAX / (size_t)(d->N > d->forces ? d->N : d->forces) && d->samples > 0)
        fail("%s: more than 2^31 numbers in all files\nhint: leave recordings out", d->path);
    make_room(d, s.lines);
    return s;
}

/* Refuses the first n bytes of a file if they are those of a compressed one. */
static void refuse_compressed(const char *path, const char *text, int n)
{
    static const struct {
        const char *mark, *name;
    } kinds[] = {{"\x1f\x8b", "gzip"}, {"PK\x03\x04", "zip, as a spreadsheet is"}, {"BZh", "bzip2"}, {"\xfd" "7zXZ", "xz"},
                 {"\x28\xb5\x2f\xfd", "zstd"}};
    size_t i;
    for (i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (n > (int)strlen(kinds[i].mark) && memcmp(text, kinds[i].mark, strlen(kinds[i].mark)) == 0)
            fail("%s: compressed (%s)\nhint: unpack it to a CSV first", path, kinds[i].name);
}

/* The next line of text, without its end, and without the marks that some programs begin a file with, which stand in the middle of
   files that are put after each other. Returns 0 at the end of the file, which is where it was when lines were counted: there is no
   room for more. */
static int next_line(const char *path, sheet *s)
{
    static const char mark[] = "\xef\xbb\xbf";
    int n = read_text(s);
    if ((n > 0) == (s->row == s->lines))
        fail("%s: %s than when its lines were counted; possible cause: %s\nhint: copy it to a file that nobody writes", path,
             n > 0 ? "longer" : "shorter", n > 0 ? "a logger still writes it" : "a pipe");
    if (n == 0) return 0;
    if (s->row++ == 0) refuse_compressed(path, s->text, n);
    s->cut = s->text[n - 1] != '\n';
    if (memchr(s->text, 0, (size_t)n) ||
        (s->row == 1 && (memcmp(s->text, "\xff\xfe", 2) == 0 || memcmp(s->text, "\xfe\xff", 2) == 0)))
        fail("%s:%d: a byte 0, or a mark of UTF-16, which no CSV has; possible cause: UTF-16, a damaged file\n"
             "hint: save it as text in UTF-8",
             path, s->row);
    if (s->text[n - 1] == '\n') s->text[n - 1] = 0;
    else if (!feof(s->f))
        fail("%s:%d: more than %d letters in a line\nhint: a line for each sample, without columns that are not used", path,
             s->row, s->size - 2);
    while (strncmp(s->text, mark, 3) == 0)
        memmove(s->text, s->text + 3, strlen(s->text + 3) + 1);
    return 1;
}

/* Nonzero if a line is another one again, the header say, with a comment mark or blanks around it or without. */
static int is_same(const char *a, const char *b)
{
    a += strspn(a, " \t#%/"), b += strspn(b, " \t#%/");
    while (*a && *a == *b)
        a++, b++;
    return a[strspn(a, " \t")] == 0 && b[strspn(b, " \t")] == 0;
}

/* All units stand below the first header: below a header that is repeated stand the same ones again. */
static void refuse_units(const motion *d, const sheet *s)
{
    fail("%s:%d: units unlike those below line %d\nhint: the same row of units below each header, or a file for each", d->path,
         s->row, s->header_row);
}

/* The line is a row of units below the first header, or below one that is repeated. */
static void keep_units(const motion *d, sheet *s, int first)
{
    if (first) strcpy(s->units, s->text), s->units_row = s->row;
    else if (!is_same(s->units, s->text)) refuse_units(d, s);
    s->again = 0;
}

/* Nonzero if a piece is what programs write in place of a number that they do not have; 1.#IND may have a sign before it and zeros
   behind it, and nan is a number. */
static int is_missing(piece w)
{
    static const char *const words[] = {"na", "n/a", "n.a.", "#n/a", "#value!", "#div/0!", "#num!", "#ref!", "#name?", "#null!",
                                        "null", "none", "nil", "nat", "\\n", "missing", "-", "--", "?", ".", "<na>", "1.#ind",
                                        "1.#qnan", "1.#snan", "1.#inf"};
    size_t i;
    int k;
    if (w.n > 4 && (*w.at == '-' || *w.at == '+')) w.at++, w.n--;
    while (w.n > 6 && w.at[w.n - 1] == '0')
        w.n--;
    for (i = 0; i < sizeof words / sizeof *words; i++) {
        for (k = 0; k < w.n && words[i][k] && tolower((unsigned char)w.at[k]) == words[i][k];)
            k++;
        if (k == w.n && !words[i][k]) return 1;
    }
    return 0;
}

/* What to do about a piece that is no finite number. */
static const char *mend_of(piece w)
{
    double x;
    if (w.n == 0) return "every sample needs all of its columns; a blank line in place of the row makes two recordings";
    if (is_missing(w)) return "a sample is missing: a blank line in place of the row makes two recordings";
    if (number(' ', w, &x)) return "only finite numbers can be learned from; a blank line in place of the row makes two recordings";
    return "write numbers like 1234.5 or 1.2345e3, one separator in the whole file; remove columns of text";
}

/* Refuses the first piece of a line that holds something and is no number, or no time. */
static void refuse_text(const motion *d, const sheet *s, int n)
{
    stamp t;
    double x;
    int c;
    for (c = 0; c < n; c++) {
        const piece w = s->w[c];
        if (c > 0 ? w.n == 0 || number(s->apart, w, &x) : read_stamp(s->apart, w, &t)) continue;
        if (c > 0)
            fail("%s:%d: column %d: expected a finite number, found \"%s\"\nhint: %s", d->path, s->row, c + 1, quoted(w),
                 mend_of(w));
        fail("%s:%d: column 1: expected a time, found \"%s\"\nhint: %s", d->path, s->row, quoted(w),
             w.n > 0 && !is_missing(w) ? "seconds, or like 2026-11-25T18:10:05.25" : mend_of(w));
    }
}

/* The time of a sample, in s, from the first one on if stamps are large. */
static double time_of(const motion *d, sheet *s, piece w)
{
    stamp t;
    read_stamp(s->apart, w, &t);
    if (s->taken == 0) {
        const double size = (double)t.whole + t.rest;
        s->kind = (int)t.kind, s->unit_said = s->unit > 0;
        s->zero = size > 1e8 && size < 9e18 ? (long long)size : t.whole;
        s->guessed = t.kind == NUMBER && s->unit <= 0 && size > 9.5e11 && size < 4.2e18; /* of this century */
        if (s->guessed) s->unit = size < 4.2e12 ? 1e-3 : size > 9.5e14 && size < 4.2e15 ? 1e-6 : size > 9.5e17 ? 1e-9 : 0;
        if (s->unit <= 0 || t.kind != NUMBER) s->unit = 1, s->guessed = 0;
    }
    if ((int)t.kind != s->kind)
        fail("%s:%d: column 1: \"%s\" is written otherwise than the times before it\nhint: one form of t in the whole file",
             d->path, s->row, quoted(w));
    return ((double)(t.whole - s->zero) + t.rest) * s->unit;
}

/* One decimal mark in the whole file: 1.500 is 1500 to some. */
static void check_mark(const motion *d, sheet *s, int c)
{
    const piece w = s->w[c];
    const char mark = (char)(memchr(w.at, ',', (size_t)w.n) ? ',' : memchr(w.at, '.', (size_t)w.n) ? '.' : 0);
    if (!mark || (c == 0 && s->kind != NUMBER)) return;
    if (s->mark && mark != s->mark)
        fail("%s:%d: column %d: \"%s\" has another decimal mark than numbers before it\nhint: points or commas in the whole file, "
             "and no marks between thousands",
             d->path, s->row, c + 1, quoted(w));
    s->mark = mark;
}

/* The pieces of a sample become numbers, s->v. */
static void read_numbers(const motion *d, sheet *s, int n)
{
    int c;
    s->v[0] = time_of(d, s, s->w[0]);
    for (c = 0; c < n; c++) {
        const piece w = s->w[c];
        if (w.n == 0) fail("%s:%d: column %d is empty\nhint: %s", d->path, s->row, c + 1, mend_of(w));
        if (c > 0 && (!number(s->apart, w, s->v + c) || !(fabs(s->v[c]) < 3e38)))
            fail("%s:%d: column %d: expected a finite number, found \"%s\"\nhint: %s", d->path, s->row, c + 1, quoted(w),
                 mend_of(w));
        check_mark(d, s, c);
    }
}

/* A name without the unit in brackets behind it. A number in brackets is an index, which is a part of the name: q[0] [deg]. */
static piece bare(piece name)
{
    int i, end;
    for (i = 1; i < name.n; i++)
        if (name.at[i] == '[' || name.at[i] == '(') {
            for (end = i + 1; end < name.n && is_digit(name.at[end]);)
                end++;
            if (end > i + 1 && end < name.n && strchr("])", name.at[end])) continue;
            while (i > 0 && name.at[i - 1] == ' ')
                i--;
            if (strchr("])", name.at[name.n - 1])) name.n = i;
            break;
        }
    return name;
}

static piece field_name(const field *f)
{
    piece w;
    w.at = f->name, w.n = (int)strlen(f->name);
    return w;
}

/* The first file's field of a column; NULL: there is none. */
static const field *field_of(const motion *d, int kind, int index)
{
    int i;
    for (i = 0; i < d->count; i++)
        if (d->fields[i].kind == kind && d->fields[i].index == index) return &d->fields[i];
    return NULL;
}

/* Nonzero if a column of the first file has this name, in whatever unit. */
static int has_name(const field *f, piece name)
{
    const piece first = bare(field_name(f)), other = bare(name);
    int i = 0;
    while (i < first.n && i < other.n && first.at[i] == printable(other.at[i]))
        i++;
    return i == first.n && i == other.n;
}

/* All files have qd and tau, or none has. */
static void check_alike(const motion *d, const sheet *s, int had_qd, int had_tau)
{
    if (d->has_qd != had_qd || d->has_tau != had_tau)
        fail("%s:%d: %s qd, %s tau here, unlike in %s\nhint: the same columns in all files", d->path, s->row,
             d->has_qd ? "with" : "no", d->has_tau ? "with" : "no", d->file[0]);
}

/* A column that is used becomes a line of the table. Its name is kept as long as the program runs. */
static void add_field(motion *d, int kind, int index, int column, const piece *name, const char *unit, double factor)
{
    field *f = &d->fields[d->count++];
    f->kind = kind, f->index = index, f->column = column, f->factor = factor;
    f->name = "-";
    if (name && name->n > 0) {
        char *const text = room((size_t)name->n + 1, 1);
        put_short(text, name->at, name->n, name->n), f->name = text;
    }
    snprintf(f->unit, sizeof f->unit, "%s", unit);
}

/* The columns t, q, qd, tau in this order. */
static void plain_fields(motion *d, const sheet *s, int names)
{
    const int N = d->N, last = 1 + N + N * d->has_qd + d->forces * d->has_tau;
    int c;
    d->fields = room((size_t)last, sizeof *d->fields);
    for (c = 0; c < last; c++) {
        const int kind = c == 0 ? OF_T : c <= N ? OF_Q : c <= 2 * N && d->has_qd ? OF_QD : OF_TAU;
        const int index = kind == OF_T ? 0 : kind == OF_Q ? c - 1 : kind == OF_QD ? c - 1 - N : c - 1 - N - N * d->has_qd;
        add_field(d, kind, index, c + 1, c < names ? &s->name[c] : NULL, "", 1);
    }
}

/* The first unit that would change numbers, its column and line: of a name, or of the row of units below it. Empty: none. */
static piece other_unit(const motion *d, sheet *s, int names, int *column, int *row)
{
    int units, c, ending;
    piece unit = {NULL, 0};
    *row = s->header_row;
    for (c = 1; c < names && c < d->count; c++) {
        unit = in_brackets(s->name[c]), *column = c + 1;
        if (unit.n == 0 && (ending = unit_ending(d->fields[c].kind, s->name[c])) >= 0)
            unit.at = known_units[ending].name, unit.n = (int)strlen(unit.at);
        if (is_other_unit(unit)) return unit;
    }
    *row = s->units_row, units = split(separator_of(s->units), s->units, s->most, s->name);
    for (c = 1; c < units && c < d->count; c++) {
        unit = s->name[c], *column = c + 1;
        if (is_other_unit(unit)) return unit;
    }
    unit.n = 0;
    return unit;
}

/* Without a column map only the unit of t counts. Tells of a unit that would change numbers, unless the file before has it, and of
   none where the file before has one. */
static void note_units(motion *d, sheet *s, int names)
{
    int column = 0, row = 0;
    const piece unit = other_unit(d, s, names, &column, &row);
    char text[sizeof d->noted];
    put_short(text, unit.at, unit.n, (int)sizeof text - 1);
    if (strcmp(text, d->noted) == 0) return;
    if (*text)
        say("%s:%d: column %d: its unit \"%s\" counts with a column map alone, such as q=2:%d; the numbers are taken as they are\n",
            d->path, row, column, text, d->N + 1);
    else
        say("warning: %s:%d: no unit here, but \"%s\" in the file before: units count with a column map alone, such as q=2:%d\n",
            d->path, s->header_row > 0 ? s->header_row : 1, d->noted, d->N + 1);
    strcpy(d->noted, text);
}

/* The columns of all files have the names of the first one. A name that another column has there is refused; the first of the
   others is told. */
static void compare_names(const motion *d, const motion *first, const sheet *s, int names)
{
    const field *other = NULL;
    int at = 0, c, k;
    for (c = 1; c < names && c < d->count; c++) {
        const int kind = d->fields[c].kind;
        const field *f = field_of(first, kind, d->fields[c].index);
        if (!f || strcmp(f->name, "-") == 0 || has_name(f, s->name[c])) continue;
        for (k = 0; k < first->count; k++)
            if (first->fields[k].kind == kind && has_name(&first->fields[k], s->name[c]))
                fail("%s:%d: column %d is called %s, but stands where %s is in the first file\nhint: the same order of columns in "
                     "all files; a column map with names takes any order",
                     d->path, s->header_row, c + 1, quoted(s->name[c]), quoted(field_name(f)));
        if (!other) other = f, at = c;
    }
    if (other)
        say("%s:%d: column %d is called %s, that of the first file %s\n", d->path, s->header_row, at + 1, quoted(s->name[at]),
            quoted(field_name(other)));
}

/* The unit of t: of the map, which s->unit holds, else of the name, else the text of a cell below it, which may be empty. Says that
   it is unknown, unless the file before said the same one, and that file and map differ. */
static void find_unit_of_t(motion *d, sheet *s, int column, piece name, piece cell)
{
    const double by_name = unit_in(name), said = by_name > 0 ? by_name : unit_of(cell);
    piece text = cell.n > 0 && !is_missing(cell) ? cell : in_brackets(name);
    char foreign[sizeof d->foreign];
    if (s->unit > 0 && said > 0 && said != s->unit)
        say("%s:%d: column %d, t, is in units of %g s, but t= says %g s, which counts\n", d->path, s->header_row, column, said,
            s->unit);
    if (s->unit > 0) return;
    s->unit = said;
    if (said > 0 || (text.n > 0 && is_digit(*text.at))) text.n = 0; /* time[0] */
    put_short(foreign, text.at, text.n, (int)sizeof foreign - 1);
    if (*foreign && strcmp(foreign, d->foreign) != 0)
        say("warning: %s:%d: column %d: the unit \"%s\" of t is unknown: t is read as if it had none\n", d->path, s->header_row,
            column, foreign);
    strcpy(d->foreign, foreign);
}

/* The first sample tells what the columns are. */
static void begin_samples(motion *d, const wanted *w, sheet *s, int n)
{
    const int most = s->most, names = read_names(d, s, n, most), had_qd = d->has_qd, had_tau = d->has_tau;
    const piece none = {NULL, 0};
    columns_are(d, w, s->row, n, names > 0 && names < most ? force_column(s, names) : 0);
    check_names(d, s, names);
    s->named = names > 0;
    if (names > 0 && s->unit <= 0) find_unit_of_t(d, s, 1, s->name[0], none);
    s->columns = n;
    if (d->samples > 0) check_alike(d, s, had_qd, had_tau);
    else plain_fields(d, s, names);
    compare_names(d, w->like ? w->like : d, s, names);
    note_units(d, s, names);
}

/* The time and the line of a sample, which is then complete. */
static void end_sample(motion *d, sheet *s, double t)
{
    const int most = d->N > d->forces ? d->N : d->forces;
    if (d->samples >= INT_MAX / most - 1)
        fail("%s:%d: more than 2^31 numbers\nhint: leave recordings out, or samples: every second one", d->path, s->row);
    d->t[d->samples] = t, d->line[d->samples] = s->row;
    d->samples++, s->taken++;
}

/* Of tau, in that of the recordings. */
static double unit_of_tau(const motion *d)
{
    return d->tau_unit > 0 ? d->tau_unit : 1;
}

/* Keeps torque i of the next sample. Its own unit is the first torque, or a later one that is more than nine times as large. */
static void keep_torque(motion *d, const wanted *w, int i, double v)
{
    const int at = d->samples * d->forces + i;
    const double was = d->tau_unit;
    int k;
    if (w->own_unit && fabs(v) > 9 * was) {
        d->tau_unit = fabs(v);
        for (k = 0; k < at && was > 0; k++)
            d->tau[k] *= (roln_real)(was / d->tau_unit);
    }
    d->tau[at] = (roln_real)(v / unit_of_tau(d));
}

/* Nonzero if a row of n pieces is the last line of the file, has no end, and is cut off: it has fewer columns than the others, or
   ends in a column that is used, and its last piece is no number. Says so. */
static int is_cut_off(const motion *d, const sheet *s, int n)
{
    const piece last = n > 0 && n <= s->most ? s->w[n - 1] : s->w[0];
    int kind, i, used = !s->map, time = n == 1;
    stamp t;
    double x;
    if (!s->cut || n == 0 || n > s->columns) return 0;
    for (kind = 0; kind < KINDS; kind++)
        for (i = 0; i < s->used[kind]; i++)
            if (s->column[kind][i] == n) used = 1, time = kind == OF_T;
    if (!used || ((s->map || n == s->columns) && (time ? read_stamp(s->apart, last, &t) : number(s->apart, last, &x)))) return 0;
    if (n == s->columns && last.n > 1 && is_missing(last)) return 0;
    say("%s:%d: the file ends in the middle of this row, which is left out\n", d->path, s->row);
    return 1;
}

/* The line read last becomes a sample. */
static void add_sample(motion *d, const wanted *w, sheet *s)
{
    const int N = d->N, F = d->forces, most = s->most;
    const double *v = s->v + 1;
    int n, i;
    if (s->apart == 0) s->apart = separator_of(s->text);
    n = split(s->apart, s->text, most, s->w);
    if (is_cut_off(d, s, n)) return;
    refuse_text(d, s, n < most ? n : most);
    if (s->columns == 0) begin_samples(d, w, s, n);
    if (n != s->columns)
        fail("%s:%d: %d columns, the lines before it have %d\nhint: every sample needs all of its columns", d->path, s->row, n,
             s->columns);
    read_numbers(d, s, n);
    for (i = 0; i < N; i++)
        d->q[d->samples * N + i] = (roln_real)v[i];
    v += N;
    for (i = 0; i < N && d->has_qd; i++)
        d->qd[d->samples * N + i] = (roln_real)v[i];
    v += d->has_qd ? N : 0;
    for (i = 0; i < F && d->has_tau; i++)
        keep_torque(d, w, i, v[i]);
    end_sample(d, s, s->v[0]);
}

/* ---- 6 column map ---- */

static const char *const kind_names[KINDS] = {"t", "q", "qd", "tau"};

/* Nonzero if a name fits a pattern, in which * stands for any letters and ? for one. */
static int fits(const char *pattern, int m, const char *name, int n)
{
    for (; m > 0 && *pattern != '*'; pattern++, name++, m--, n--)
        if (n == 0 || (*pattern != *name && *pattern != '?')) return 0;
    if (m == 0) return n == 0;
    for (; n >= 0; name++, n--)
        if (fits(pattern + 1, m - 1, name, n)) return 1;
    return 0;
}

/* One setting of the map while it is read: KEY=COLUMNS[,UNIT[*GAINS]]. */
typedef struct {
    const motion *d;
    sheet *s;
    int kind, names, columns; /* names, columns of the file */
    const char *text;
    int unit;       /* of known_units; -1: not said */
    int gains, per; /* numbers behind * or /; nonzero: / */
    double gain[64];
} choice;

/* Refuses a setting of the map. */
static void refuse_choice(const choice *c, const char *what, piece item, const char *hint)
{
    fail("%s=%s: \"%s\" %s\nhint: %s", kind_names[c->kind], c->text, quoted(item), what, hint);
}

/* Takes one more column, from 1; 0: none, which has a torque of 0. */
static void take_column(choice *c, int column, piece item)
{
    sheet *s = c->s;
    if (column > c->columns)
        fail("%s:%d: %d columns, but %s=%s asks for column %d\nhint: columns count from 1", c->d->path, s->row, c->columns,
             kind_names[c->kind], c->text, column);
    if (s->used[c->kind] >= c->columns + c->d->N) refuse_choice(c, "is one column too many", item, "name each column once");
    s->column[c->kind][s->used[c->kind]++] = column;
    if (column > s->last) s->last = column;
}

/* Columns by number: 3, 3:8. Returns 0 if the item is neither. */
static int read_range(piece item, int *from, int *to)
{
    int i = 0;
    *from = 0;
    while (i < item.n && i < 6 && is_digit(item.at[i]))
        *from = 10 * *from + item.at[i++] - '0';
    if (i == 0) return 0;
    *to = *from;
    if (i < item.n && item.at[i] == ':')
        for (*to = 0, i++; i < item.n && i < 13 && is_digit(item.at[i]); i++)
            *to = 10 * *to + item.at[i] - '0';
    return i == item.n;
}

static int take_numbers(choice *c, piece item)
{
    int from, to, k;
    if (!read_range(item, &from, &to)) return 0;
    if (to < from || (from == 0 && (to > 0 || c->kind != OF_TAU)))
        refuse_choice(c, "is no range of columns", item,
                      "columns count from 1, and go up: 3:8; tau=5,0 is for a joint without motor");
    for (k = from; k <= to; k++)
        take_column(c, k, item);
    return 1;
}

/* Nonzero if a name of the header, with the unit in brackets behind it or without, fits a name or pattern of the map. */
static int is_meant(piece item, piece name)
{
    const piece stem = bare(name);
    return fits(item.at, item.n, name.at, name.n) || fits(item.at, item.n, stem.at, stem.n);
}

/* Columns by name or pattern. Returns 0 if there are none. */
static int take_names(choice *c, piece item)
{
    int found = 0, k;
    for (k = 0; k < c->names; k++) {
        if (!is_meant(item, c->s->name[k])) continue;
        take_column(c, k + 1, item);
        found++;
    }
    return found;
}

/* A unit, with gains behind it or not. Returns 0 if the item is none. */
static int take_unit(choice *c, piece item)
{
    const int unit = c->kind == OF_T ? -1 : find_unit(c->kind, item.at, item.n);
    double x;
    int m;
    if (c->kind == OF_T) {
        if (unit_of(item) <= 0) return 0;
        c->gain[0] = unit_of(item), c->gains = 1, c->unit = 0;
        return 1;
    }
    if (unit < 0) return 0;
    c->unit = unit, m = (int)strlen(known_units[unit].name);
    if (m < item.n) {
        c->per = item.at[m] == '/';
        item.at += m + 1, item.n -= m + 1;
        if (!number(' ', item, &x) || !(fabs(x) < 1e30) || x == 0)
            refuse_choice(c, "is no gain", item,
                          "a unit, * and a gain for each motor: A*14.9,13.3; or counts/4096, counts per turn");
        c->gain[c->gains++] = x;
    }
    if (known_units[unit].per && !c->per)
        refuse_choice(c, "needs the counts per turn", item, "counts/4096, with one number or one for each joint");
    return 1;
}

/* One item of a setting, between commas. */
static void take_item(choice *c, piece item)
{
    static const char *const hint =
        "KEY=COLUMNS,UNIT: columns by number (3:8), by name or pattern (pos*) of the header; then perhaps a "
        "unit";
    double x = 0;
    if (c->unit >= 0) { /* a gain */
        if (c->gains == 0 || c->kind == OF_T || c->gains >= 64 || !number(' ', item, &x) || !(fabs(x) < 1e30) || x == 0)
            refuse_choice(c, "stands behind the unit", item, "the unit comes last, and gains behind it: A*14.9,13.3");
        c->gain[c->gains++] = x;
        return;
    }
    if (take_numbers(c, item) || take_names(c, item) || take_unit(c, item)) return;
    if (c->names == 0)
        refuse_choice(c, "is a name or an unknown unit, but the file has no header", item, "columns by number, from 1: q=2:7");
    fail("%s:%d: no column is called \"%s\", which %s=%s asks for\nhint: %s", c->d->path, c->s->header_row, quoted(item),
         kind_names[c->kind], c->text, hint);
}

/* Refuses a setting of the map that is not `count` columns; names the first of them. */
static void refuse_count(const choice *c, const wanted *w, int count)
{
    const sheet *s = c->s;
    char text[120] = "";
    int i;
    for (i = 0; i < s->used[c->kind] && c->names > 0 && strlen(text) < 60; i++) {
        const int column = s->column[c->kind][i];
        if (column > 0 && column <= c->names)
            snprintf(text + strlen(text), sizeof text - strlen(text), "%s%s", i ? ", " : ": ", quoted(s->name[column - 1]));
    }
    fail("%s:%d: %s=%s is %d columns%s%s, but %s has %d %s\nhint: %s", c->d->path, s->row, kind_names[c->kind], c->text,
         s->used[c->kind], text, i < s->used[c->kind] && i > 0 ? " .." : "", w->model, count,
         c->kind == OF_T                  ? "column of time"
         : c->kind == OF_TAU && w->inputs ? "inputs"
                                          : "joints",
         c->kind == OF_TAU ? "tau=5,0 is for two joints, of which the second one has no motor"
                           : "as many columns as the model has; in names * stands for any letters, ? for one");
}

/* Reads KEY=TEXT: the columns of one kind. Their number must be `count`, as the model has it. */
static choice choose(const motion *d, const wanted *w, sheet *s, int kind, int names, int columns, int count)
{
    choice c = {0};
    const char *p = w->columns[kind];
    c.d = d, c.s = s, c.kind = kind, c.names = names, c.columns = columns, c.text = p, c.unit = -1;
    s->column[kind] = room((size_t)(columns + d->N) + 2, sizeof **s->column);
    while (*p) {
        piece item;
        item.at = p, item.n = (int)strcspn(p, ",");
        if (item.n > 0) take_item(&c, item);
        p += item.n + (p[item.n] == ',');
    }
    if (s->used[kind] != count) refuse_count(&c, w, count);
    if (c.gains > 1 && c.gains != count)
        fail("%s=%s: %d gains for %d columns\nhint: one gain for all, or one for each", kind_names[kind], c.text, c.gains, count);
    return c;
}

/* Nonzero if a setting begins with a column by number, or there is none. */
static int is_by_number(const char *text)
{
    return !text || is_digit(*text) || strcmp(text, "none") == 0;
}

/* What the file says of a column's unit, in the row of units, or in brackets behind the name; empty: nothing. */
static piece unit_text(const sheet *s, int column, const piece *unit, int units)
{
    piece x = {NULL, 0};
    int i;
    if (column > 0 && column <= units) x = unit[column - 1];
    else if (column > 0) {
        const piece name = s->name[column - 1], stem = bare(name);
        if (s->named && stem.n < name.n) x.at = stem.at + stem.n, x.n = name.n - stem.n;
    }
    while (x.n > 0 && strchr(" [(", *x.at))
        x.at++, x.n--;
    for (i = 0; i < x.n && !strchr("])", x.at[i]);)
        i++;
    x.n = i;
    return x;
}

/* The unit of a column, an index of known_units: of the map, else of the file; -1: none, or it is unknown, *foreign. Says that a
   unit is unknown, and that file and map differ. */
static int unit_said(const motion *d, const sheet *s, const choice *c, int column, const piece *unit, int units, piece *foreign)
{
    const piece x = unit_text(s, column, unit, units);
    int found = x.n > 0 ? find_unit(c->kind, x.at, x.n) : s->named && column > 0 ? unit_ending(c->kind, s->name[column - 1]) : -1;
    if (x.n > 0 && found >= 0 && ((int)strlen(known_units[found].name) != x.n || known_units[found].per)) found = -1;
    foreign->at = x.at, foreign->n = 0;
    if (c->unit >= 0) {
        if (found >= 0 && known_units[found].factor != known_units[c->unit].factor)
            say("%s:%d: column %d is in %s, but %s=%s says %s, which counts\n", d->path, s->header_row, column,
                known_units[found].name, kind_names[c->kind], c->text, known_units[c->unit].name);
        return c->unit;
    }
    if (found < 0) foreign->n = x.n;
    if (foreign->n > 0 && s->first_file)
        say("%s:%d: column %d: its unit \"%s\" is unknown; its numbers are taken as they are\n", d->path, s->header_row, column,
            quoted(x));
    return found;
}

/* What a message says of a unit: known, foreign or none. */
static void put_unit(char *to, const char *known, const char *foreign)
{
    sprintf(to, *known ? "the unit %s" : *foreign ? "the unknown unit \"%s\"" : "no unit", *known ? known : foreign);
}

/* Refuses a column whose unit this file says and the first one does not, or the other way round: one of them would be read in
   another unit. So would be an unknown unit beside any other one. */
static void refuse_other_unit(const motion *d, const sheet *s, const choice *c, int index, int unit, const char *foreign)
{
    const field *first = field_of(d, c->kind, index);
    const double factor = unit >= 0 ? known_units[unit].factor : 1;
    const char *const known = unit >= 0 ? known_units[unit].name : "";
    char here[64], there[64];
    if (s->first_file || c->unit >= 0 || !first || s->column[c->kind][index] == 0 || first->column == 0) return;
    if (*foreign || first->foreign[0] ? strcmp(foreign, first->foreign) == 0
                                      : !*known == !first->unit[0] || (factor == 1 && first->factor == 1))
        return;
    put_unit(here, known, foreign), put_unit(there, first->unit, first->foreign);
    fail("%s:%d: column %d, %s%d, has %s, but %s in the first file\nhint: the same unit in all files, or name it in the map: "
         "%s=%s,%s",
         d->path, s->row, s->column[c->kind][index], kind_names[c->kind], index + 1, here, there, kind_names[c->kind], c->text,
         *known           ? known
         : first->unit[0] ? first->unit
                          : "raw");
}

/* A pattern takes the columns of each file in the order of the first one, by their names. Says which names differ. */
static void order_by_names(const motion *d, sheet *s, const choice *c)
{
    int *const column = s->column[c->kind], *const was = room((size_t)s->used[c->kind] + 1, sizeof *was);
    const int by_number = is_by_number(c->text);
    int i, k, found = 0, other = -1;
    for (i = 0; i < s->used[c->kind]; i++) {
        const field *first = field_of(d, c->kind, i);
        was[i] = column[i];
        if (!first || !s->named || strcmp(first->name, "-") == 0 || column[i] == 0) continue;
        if (!has_name(first, s->name[column[i] - 1]) && other < 0) other = i;
    }
    for (i = 0; i < s->used[c->kind] && other >= 0 && !by_number; i++) {
        found += was[i] == 0 && field_of(d, c->kind, i)->column == 0; /* a joint without motor */
        for (k = 0; k < s->used[c->kind] && was[i] > 0; k++)
            if (was[k] > 0 && has_name(field_of(d, c->kind, i), s->name[was[k] - 1])) {
                column[i] = was[k], found++;
                break;
            }
    }
    if (other >= 0 && found < s->used[c->kind]) {
        memcpy(column, was, (size_t)s->used[c->kind] * sizeof *was);
        say("%s:%d: column %d is called %s, %s%d of the first file is %s\n", d->path, s->header_row, was[other],
            quoted(s->name[was[other] - 1]), kind_names[c->kind], other + 1, quoted(field_name(field_of(d, c->kind, other))));
    }
    free(was);
}

/* Factors and lines of the table, of the columns of one kind. */
static void fill_fields(motion *d, sheet *s, const choice *c, const piece *unit, int units)
{
    const int kind = c->kind;
    int i;
    if (!s->first_file) order_by_names(d, s, c);
    s->factor[kind] = room((size_t)s->used[kind] + 1, sizeof **s->factor);
    for (i = 0; i < s->used[kind]; i++) {
        const int column = s->column[kind][i];
        piece foreign = {NULL, 0};
        const int said = kind != OF_T ? unit_said(d, s, c, column, unit, units, &foreign) : c->unit;
        const double gain = c->gains == 0 ? 1 : c->gain[c->gains > 1 ? i : 0];
        const double factor = (kind != OF_T && said >= 0 ? known_units[said].factor : 1) * (c->per ? 1 / gain : gain);
        char text[24] = "", other[24];
        put_short(other, foreign.at, foreign.n, (int)sizeof other - 1);
        if (kind != OF_T && said >= 0)
            snprintf(text, sizeof text, c->gains == 0 ? "%s" : c->per ? "%s/%g" : "%s*%g", known_units[said].name, gain);
        s->factor[kind][i] = factor;
        if (kind != OF_T) refuse_other_unit(d, s, c, i, said, other);
        if (!s->first_file) continue;
        add_field(d, kind, i, column, s->named && column > 0 ? &s->name[column - 1] : NULL, text, factor);
        strcpy(d->fields[d->count - 1].foreign, other);
    }
}

/* The column of time, if the map does not say: the first one of the header with such a name, 0: none; *other: the second one. */
static int time_column(const sheet *s, int names, int *other)
{
    int at = 0, i;
    for (i = 0; i < names && *other == 0; i++)
        if (is_time(s->name[i])) *(at > 0 ? other : &at) = i + 1;
    return at;
}

/* t=, or the column that the header calls so, or with dt= the number of the row. */
static void choose_time(motion *d, const wanted *w, sheet *s, int names, int n)
{
    if (w->columns[OF_T] && strcmp(w->columns[OF_T], "none") != 0) {
        const choice c = choose(d, w, s, OF_T, names, n, 1);
        if (c.gains > 0) s->unit = c.gain[0];
        fill_fields(d, s, &c, NULL, 0);
    } else {
        int other = 0;
        const int at = w->columns[OF_T] ? 0 : time_column(s, names, &other);
        if (other > 0 && !(w->dt > 0))
            fail("%s:%d: columns %d and %d, \"%s\" and \"%s\", are both called a time\nhint: name the one that counts: t=%d, say",
                 d->path, s->header_row, at, other, quoted(s->name[at - 1]), quoted(s->name[other - 1]), at);
        if (at == 0 && !(w->dt > 0))
            fail("%s:%d: no column is called a time\nhint: name it: t=1, say; if there is none, dt=0.01: 10 ms from row to row",
                 d->path, s->row);
        s->column[OF_T] = room(1, sizeof **s->column);
        *s->column[OF_T] = other > 0 ? 0 : at, s->used[OF_T] = *s->column[OF_T] > 0;
        if (*s->column[OF_T] > s->last) s->last = at;
        if (s->first_file) add_field(d, OF_T, 0, *s->column[OF_T], s->used[OF_T] ? &s->name[at - 1] : NULL, "", 1);
    }
}

/* Refuses a column that is used twice. */
static void check_once(const motion *d, const sheet *s, const wanted *w)
{
    int a, b, i, j;
    for (a = 0; a < KINDS; a++)
        for (b = 0; b <= a; b++)
            for (i = 0; i < s->used[a]; i++)
                for (j = 0; j < (a == b ? i : s->used[b]); j++)
                    if (s->column[a][i] > 0 && s->column[a][i] == s->column[b][j])
                        fail("%s:%d: column %d is used twice, by %s=%s and %s=%s\nhint: each column once", d->path, s->row,
                             s->column[a][i], kind_names[b], w->columns[b] ? w->columns[b] : "", kind_names[a],
                             w->columns[a] ? w->columns[a] : "");
}

/* The names of the header, to s->name. Returns how many there are; 0: there is no header. */
static int split_header(const sheet *s)
{
    const char *text = s->header + strspn(s->header, s->comment ? " \t#%/" : "");
    if (s->header_row == 0) return 0;
    return split(s->apart && strchr(text, s->apart) ? s->apart : separator_of(text), text, s->most, s->name);
}

/* The first sample of a file: which columns the map means. */
static void begin_mapped(motion *d, const wanted *w, sheet *s, int n, int cells)
{
    const int F = d->forces;
    const piece none = {NULL, 0};
    int names = split_header(s), kind, units;
    if (names > s->most || n > s->most) fail("%s:%d: more than %d columns\nhint: take some out", d->path, s->row, s->most);
    if ((s->by_number || s->comment) && (names < n || names > cells)) names = 0;
    if (names > 0 && (names < n || names > cells))
        fail("%s:%d: %d names, but %d columns in line %d\nhint: one name a column, apart as the numbers are; or columns by number",
             d->path, s->header_row, names, names < n ? n : cells, s->row);
    s->named = names > 0, s->columns = names > n ? names : n, s->cells = cells, s->behind = 0;
    units = *s->units ? split(s->apart, s->units, s->most, s->w) : 0;
    s->first_file = d->samples == 0 && !w->like;
    if (d->samples == 0) {
        d->mapped = 1, d->has_qd = w->columns[OF_QD] != NULL, d->has_tau = w->columns[OF_TAU] != NULL;
        d->fields = room(1 + 2 * (size_t)d->N + (size_t)F, sizeof *d->fields);
        d->measured = 1;
        if (w->like) memcpy(d->fields, w->like->fields, (size_t)w->like->count * sizeof *d->fields), d->count = w->like->count;
    }
    if (w->torque && !d->has_tau) fail("%s:%d: torque=1 needs tau=\nhint: tau=14:19, say, or leave torque=1 out", d->path, s->row);
    choose_time(d, w, s, names, s->columns);
    for (kind = OF_Q; kind < KINDS; kind++)
        if (w->columns[kind]) {
            const choice c = choose(d, w, s, kind, names, s->columns, kind == OF_TAU ? F : d->N);
            fill_fields(d, s, &c, s->w, units);
        }
    check_once(d, s, w);
    if (s->used[OF_T] > 0) {
        const int at = *s->column[OF_T];
        find_unit_of_t(d, s, at, s->named ? s->name[at - 1] : none, at <= units ? s->w[at - 1] : none);
    }
}

/* Numbers of the columns of a kind, times their factors, to x. Returns 0 if one is missing. */
static int mapped_numbers(motion *d, const wanted *w, sheet *s, int kind, int n, roln_real *x)
{
    int i;
    for (i = 0; i < s->used[kind]; i++) {
        const int at = s->column[kind][i] - 1;
        double v = 0;
        if (at >= n || (at >= 0 && (s->w[at].n == 0 || is_missing(s->w[at])))) return 0;
        if (at >= 0 && !number(s->apart, s->w[at], &v))
            fail("%s:%d: column %d: expected a number, found \"%s\"\nhint: %s", d->path, s->row, at + 1, quoted(s->w[at]),
                 mend_of(s->w[at]));
        v *= s->factor[kind][i];
        if (!(fabs(v) < 3e38)) return 0;
        if (at >= 0) check_mark(d, s, at);
        if (kind == OF_TAU) keep_torque(d, w, i, v);
        else x[i] = (roln_real)v;
    }
    return 1;
}

/* How many pieces of a line are numbers. */
static int count_numbers(const sheet *s, char apart)
{
    const int n = split(apart, s->text, s->most, s->w);
    int count = 0, i;
    double x;
    for (i = 0; i < n && i < s->most; i++)
        count += number(apart, s->w[i], &x);
    return count;
}

/* What stands between the columns of samples: what the first one looks like; or the header, if that makes more numbers of it, for a
   column of text may hold another separator. */
static char apart_of(const sheet *s)
{
    const char own = separator_of(s->text), named = s->header_row > 0 ? separator_of(s->header) : own;
    if (s->apart) return s->apart;
    return named != own && count_numbers(s, named) > count_numbers(s, own) ? named : own;
}

/* Keeps the first column behind the last that is used that holds a number, of a row of n pieces. */
static void find_behind(sheet *s, int n)
{
    double x;
    int i;
    for (i = s->last; i < n && (s->behind == 0 || i + 1 < s->behind); i++)
        if (number(s->apart, s->w[i], &x)) s->behind = i + 1;
}

/* Nonzero if a row of too few cells may have lost one in front of the last column that is used: what belongs behind would be there.
   It has lost none if only text has been behind, and there is a number. */
static int is_lost(const sheet *s, int cells)
{
    double x;
    if (cells < s->last || !number(s->apart, s->w[s->last - 1], &x)) return 1;
    return s->behind > 0 && s->behind <= s->last + s->cells - cells;
}

/* The line read last becomes a sample, or is left out if a number is missing; so is a row that has lost a cell, whichever it is. */
static void add_mapped(motion *d, const wanted *w, sheet *s)
{
    int n, cells, kind, whole, lost;
    double t = s->rows * w->dt;
    if (s->columns == 0) {
        s->apart = apart_of(s);
        n = split_cells(s->apart, s->text, s->most, s->w, &cells);
        begin_mapped(d, w, s, n, cells);
    }
    n = split_cells(s->apart, s->text, s->most, s->w, &cells);
    if (n > s->columns)
        fail("%s:%d: %d columns, the %s has %d\nhint: put text that holds a separator in quotes", d->path, s->row, n,
             s->named ? "header" : "first row", s->columns);
    if (is_cut_off(d, s, n)) return;
    if (cells >= s->cells) find_behind(s, n);
    lost = n < s->columns && cells < s->cells && is_lost(s, cells), whole = !lost;
    if (lost && d->lost++ == 0)
        say("%s:%d: %d cells, the first row has %d: a cell is lost, and nobody knows which one; such rows are left out\n", d->path,
            s->row, cells, s->cells);
    for (kind = OF_Q; kind < KINDS && whole; kind++) {
        roln_real *to = kind == OF_Q ? d->q : kind == OF_QD ? d->qd : d->tau;
        whole = mapped_numbers(d, w, s, kind, n, to + (size_t)d->samples * (size_t)(kind == OF_TAU ? d->forces : d->N));
    }
    s->rows++;
    if (whole && s->used[OF_T] > 0) {
        const int at = *s->column[OF_T] - 1;
        stamp x;
        whole = at < n && s->w[at].n > 0 && !is_missing(s->w[at]);
        if (whole && !read_stamp(s->apart, s->w[at], &x))
            fail("%s:%d: column %d: expected a time, found \"%s\"\nhint: seconds, or like 2026-11-25T18:10:05.25; t= names the "
                 "column",
                 d->path, s->row, at + 1, quoted(s->w[at]));
        if (whole) t = time_of(d, s, s->w[at]);
    } else if (whole && s->unit <= 0) s->unit = 1;
    if (whole) end_sample(d, s, t);
    else if (d->left_out++ == d->lost && !lost)
        say("%s:%d: a number is missing in a column that is used; such rows are left out\n", d->path, s->row);
}

/* Nonzero if the map asks for a column, from 0, by its number or by its name, the first of `names` in s->name. */
static int is_asked(const sheet *s, int names, int column)
{
    int kind, from, to;
    for (kind = 0; kind < KINDS; kind++) {
        const char *p = s->map->columns[kind];
        while (p && *p) {
            piece item;
            item.at = p, item.n = (int)strcspn(p, ",");
            if (read_range(item, &from, &to) ? from <= column + 1 && column + 1 <= to
                                             : item.n > 0 && column < names && is_meant(item, s->name[column]))
                return 1;
            p += item.n + (p[item.n] == ',');
        }
    }
    return 0;
}

/* How many of the first n columns the map asks for, where the first `names` of them have names. */
static int count_asked(const sheet *s, int names, int n)
{
    int count = 0, c;
    for (c = 0; c < n && c < s->most; c++)
        count += is_asked(s, names, c);
    return count;
}

/* Nonzero if a piece is a unit of something, in brackets or not. */
static int is_unit(piece w)
{
    int kind;
    if (w.n > 2 && strchr("[(", *w.at)) w.at++, w.n -= 2;
    for (kind = OF_Q; kind < KINDS && w.n > 0; kind++)
        if (find_unit(kind, w.at, w.n) >= 0) return 1;
    return unit_of(w) > 0;
}

/* Whether a line is the first sample: the pieces that the map asks for vote, or, if it asks for none of them, all. Most must be
   numbers, times or words for a missing number. A row of such words alone must stand below a header, without a unit. */
static int is_first_sample(const sheet *s)
{
    struct {
        int full, numbers, missing;
    } asked = {0, 0, 0}, all = {0, 0, 0};
    int cells, units = 0, i;
    const char apart = apart_of(s);
    const int names = split_header(s), n = split_cells(apart, s->text, s->most, s->w, &cells);
    for (i = 0; i < n && i < s->most; i++) {
        stamp t;
        double x;
        const int is = is_missing(s->w[i]) ? 2 : number(apart, s->w[i], &x) || (i < 3 && read_stamp(apart, s->w[i], &t));
        if (s->w[i].n == 0) continue;
        units += is_unit(s->w[i]);
        all.full++, all.numbers += is == 1, all.missing += is == 2;
        if (is_asked(s, names, i)) asked.full++, asked.numbers += is == 1, asked.missing += is == 2;
    }
    if (asked.full > 0) all = asked;
    if (all.numbers == 0) return all.full > 0 && all.missing == all.full && units == 0 && names > 0 && cells >= names;
    return 2 * (all.numbers + all.missing) >= all.full;
}

/* Whether a line is a sample. Behind the first one: a column that is used begins like a number; or none of them holds text, and
   something in the line is a number or a word for a missing one. */
static int is_mapped_sample(const sheet *s)
{
    int n, kind, text = 0, i;
    double x;
    if (s->columns == 0) return is_first_sample(s);
    n = split(s->apart, s->text, s->most, s->w);
    for (kind = 0; kind < KINDS; kind++)
        for (i = 0; i < s->used[kind]; i++) {
            const int c = s->column[kind][i] - 1;
            if (c < 0 || c >= n) continue;
            if (is_numeric(s->apart, s->w[c])) return 1;
            text |= s->w[c].n > 0 && !is_missing(s->w[c]);
        }
    for (i = 0; i < n && i < s->most && !text; i++)
        if (is_missing(s->w[i]) || number(s->apart, s->w[i], &x)) return 1;
    return 0;
}

/* Nonzero if a line is a row of units below the header: no piece is a name of the header, unless it is a unit, too, and a unit
   stands in a column that the map asks for, or in one that is called a time. */
static int is_units(const sheet *s)
{
    const int n = split(separator_of(s->text), s->text, s->most, s->w), names = split_header(s);
    const int all = count_asked(s, names, names) == 0;
    int found = 0, i, k;
    if (n > names) return 0;
    for (i = 0; i < n && i < s->most; i++) {
        const piece x = s->w[i];
        const int unit = is_unit(x);
        for (k = 0; k < names && k < s->most && x.n > 0 && !unit; k++)
            if (x.n == s->name[k].n && memcmp(x.at, s->name[k].at, (size_t)x.n) == 0) return 0;
        found |= unit && (all || is_asked(s, names, i) || is_time(s->name[i]));
    }
    return found;
}

/* Nonzero if fewer columns that the map asks for stand in a line than in the header. */
static int is_no_header(sheet *s)
{
    const int names = split_header(s), had = count_asked(s, names, names);
    const int n = split(separator_of(s->text), s->text, s->most, s->name);
    return s->header_row > 0 && count_asked(s, n, n) < had;
}

/* A line of text or a comment above samples: the header, or the units below it. Returns nonzero if a recording begins behind it. */
static int read_mapped_heading(const motion *d, sheet *s, int comment)
{
    const int had = s->header_row > 0 && !s->comment, units = !comment && had && is_units(s);
    if (had && is_same(s->text, s->header)) return s->again = 1;
    if (comment && (had || s->columns > 0)) return 0;
    if (s->columns > 0 && !(units && s->again)) {
        piece whole;
        whole.at = s->text, whole.n = (int)strlen(s->text);
        fail("%s:%d: expected numbers, found \"%s\"\nhint: another header needs a file of its own; put # before other text between "
             "samples",
             d->path, s->row, quoted(whole));
    }
    if (units) {
        keep_units(d, s, s->columns == 0);
        return 0;
    }
    if (is_no_header(s)) {
        if (!comment)
            say("%s:%d: text, not a header: line %d has more of the columns of the map\n", d->path, s->row, s->header_row);
        return 0;
    }
    strcpy(s->header, s->text);
    s->header_row = s->row, s->comment = comment, *s->units = 0;
    return 0;
}

/* ---- 7 time stamps ---- */

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

/* What the steps of t are like. */
typedef struct {
    int even;           /* nonzero: they differ by 1 % at most */
    int steady;         /* nonzero: but for rounding and missing samples they are those of a clock */
    double mean;        /* step of that clock; else the mean, without gaps */
    double digit;       /* t is a multiple of this, in s; 0: of nothing */
    double least, most; /* steps */
    int missing;        /* samples, of a steady clock */
} pace;

/* A gap of more than so many steps splits a recording. */
#define GAP 5.5

/* Recordings begin where t starts again: it goes back by half of a recording or more, of a short one to its beginning. Any other
   step back is refused. */
static void split_restarts(motion *d)
{
    const size_t most = (size_t)d->samples + 1;
    int *const first = room(most, sizeof *first), parts = 0, told = 0, k, i;
    const char **const names = room(most, sizeof *names);
    double *const origin = room(most, sizeof *origin);
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k]; i < d->first[k + 1]; i++) {
            const double step = i > d->first[k] ? d->t[i] - d->t[i - 1] : -1, zero = d->origin[k];
            if (step >= 0) continue;
            if (i > d->first[k]) {
                const double begin = d->t[first[parts - 1]];
                const int few = i - first[parts - 1] < 20; /* so few are rather rows in a wrong order */
                if ((d->clock && step < -43200) || -step < 0.5 * (d->t[i - 1] - begin) || (few && d->t[i] > begin))
                    fail("%s:%d: t goes back from %.12g to %.12g s\nhint: %s", d->file[k], d->line[i], d->t[i - 1] + zero,
                         d->t[i] + zero,
                         d->clock && step < -43200
                             ? "a time of the day begins anew at midnight: write the date, too: 2026-11-25T18:10:05.25"
                             : "a blank line belongs between two recordings; in one recording, t goes up");
                if (told++ == 0) say("%s:%d: t starts again: a new recording, here and wherever it does\n", d->file[k], d->line[i]);
            }
            first[parts] = i, names[parts] = d->file[k], origin[parts++] = zero;
        }
    first[parts] = d->samples;
    free(d->first), free(d->file), free(d->origin);
    d->first = first, d->file = names, d->origin = origin, d->trajectories = parts;
}

/* Sample `from` becomes sample `to`. */
static void move_sample(motion *d, int from, int to)
{
    const size_t row = (size_t)d->N * sizeof *d->q, forces = (size_t)d->forces * sizeof *d->tau;
    memmove(d->q + to * d->N, d->q + from * d->N, row), memmove(d->qd + to * d->N, d->qd + from * d->N, row);
    memmove(d->tau + to * d->forces, d->tau + from * d->forces, forces);
    d->t[to] = d->t[from], d->line[to] = d->line[from];
}

/* Samples that are written twice, with the same t and the same numbers, are taken once. */
static void drop_repeats(motion *d)
{
    const size_t row = (size_t)d->N * sizeof *d->q, forces = (size_t)d->forces * sizeof *d->tau;
    int to = 0, twice = 0, k, i;
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], b = d->first[k + 1];
        d->first[k] = to;
        for (i = a; i < b; i++) {
            const int before = to - 1;
            if (i > a && !(d->t[i] > d->t[before]) && memcmp(d->q + i * d->N, d->q + before * d->N, row) == 0 &&
                memcmp(d->qd + i * d->N, d->qd + before * d->N, row) == 0 &&
                memcmp(d->tau + i * d->forces, d->tau + before * d->forces, forces) == 0) {
                if (twice++ == 0) say("%s:%d: a sample is written twice; such a sample is taken once\n", d->file[k], d->line[i]);
                continue;
            }
            if (i != to) move_sample(d, i, to);
            to++;
        }
    }
    d->first[d->trajectories] = d->samples = to;
}

/* The median of the nine samples of a column about sample i, of those of its recording, a .. b - 1. */
static double median_beside(const roln_real *x, int columns, int a, int b, int i)
{
    const int count = b - a < 9 ? b - a : 9, from = i - 4 < a ? a : i + 5 > b ? b - count : i - 4;
    double near[9];
    int k, m;
    for (k = 0; k < count; k++) {
        const double v = (double)x[(from + k) * columns];
        for (m = k; m > 0 && near[m - 1] > v; m--)
            near[m] = near[m - 1];
        near[m] = v;
    }
    return near[count / 2];
}

/* The end of the part of recording k that begins at sample a: a gap ends it, or the recording does. */
static int part_end(const motion *d, int k, int a)
{
    const int first = d->first[k], end = d->first[k + 1];
    const double mean = (d->t[end - 1] - d->t[first]) / (end - first);
    int i = a + 1;
    while (i < end && d->t[i] - d->t[i - 1] <= GAP * mean)
        i++;
    return i;
}

/* Marks rows whose number in a column is wild: farther from the median beside it than 20 times what one sample in 1,000 (four at
   least) may exceed, and than a quarter of the range of the others; a torque may jump, so twice that range. Says which. Returns
   how many. off, sorted [samples] are scratch. */
static int mark_wild(const motion *d, int kind, int j, double *off, double *sorted, unsigned char *wild)
{
    const int n = d->samples, rare = n / 1000 > 4 ? n / 1000 : 4, columns = kind == OF_TAU ? d->forces : d->N;
    const roln_real *x = (kind == OF_Q ? d->q : kind == OF_QD ? d->qd : d->tau) + j;
    const double unit = kind == OF_TAU ? unit_of_tau(d) : 1;
    double most, range;
    int count = 0, k, i, a, b;
    if (n < 8 * rare) return 0;
    for (k = 0; k < d->trajectories; k++)
        for (a = d->first[k]; a < d->first[k + 1]; a = b)
            for (b = part_end(d, k, a), i = a; i < b; i++)
                off[i] = (double)x[i * columns] - median_beside(x, columns, a, b, i);
    for (i = 0; i < n; i++)
        sorted[i] = (double)x[i * columns];
    qsort(sorted, (size_t)n, sizeof *sorted, smaller);
    range = sorted[n - 1 - rare] - sorted[rare];
    for (i = 0; i < n; i++)
        sorted[i] = fabs(off[i]);
    qsort(sorted, (size_t)n, sizeof *sorted, smaller);
    most = fmax(20 * sorted[n - 1 - rare], (kind == OF_TAU ? 2 : 0.25) * range);
    if (!(range > 0) || !(sorted[n - 1] > most)) return 0;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k]; i < d->first[k + 1]; i++) {
            if (!(fabs(off[i]) > most)) continue;
            if (count++ == 0)
                say("%s:%d: %s%d is wild: %.4g, beside %.4g", d->file[k], d->line[i], kind_names[kind], j + 1,
                    unit * (double)x[i * columns], unit * ((double)x[i * columns] - off[i]));
            wild[i] = 1;
        }
    if (count > 1) say("; so are %d more rows: left out\n", count - 1);
    else say(": the row is left out\n");
    return count;
}

/* Leaves rows out in which a number is wild. q of an angle may begin anew, so it is not asked. */
static void drop_wild(motion *d, const wanted *w)
{
    unsigned char *wild = room((size_t)d->samples, 1);
    double *off = room((size_t)d->samples, sizeof *off), *sorted = room((size_t)d->samples, sizeof *sorted);
    int to = 0, rows = 0, j, k, i;
    for (j = 0; j < d->N; j++) {
        if (!(j < 32 && w->angles >> j & 1)) rows += mark_wild(d, OF_Q, j, off, sorted, wild);
        if (d->has_qd && !w->qd_unused) rows += mark_wild(d, OF_QD, j, off, sorted, wild);
    }
    for (j = 0; j < d->forces && d->has_tau; j++)
        rows += mark_wild(d, OF_TAU, j, off, sorted, wild);
    for (k = 0; k < d->trajectories && rows > 0; k++) {
        const int a = d->first[k], b = d->first[k + 1];
        d->first[k] = to;
        for (i = a; i < b; i++)
            if (!wild[i]) move_sample(d, i, to++);
    }
    if (rows > 0) d->first[d->trajectories] = d->samples = to;
    free(wild), free(off), free(sorted);
}

/* If all torques are far below their own unit, it is that of a row that was left out. The largest torque then becomes the unit. */
static void check_unit(motion *d)
{
    double most = 0;
    int i;
    for (i = 0; i < d->samples * d->forces && d->has_tau; i++)
        most = fmax(most, fabs((double)d->tau[i]));
    if (!(d->tau_unit > 0) || !(9 * most < 1)) return;
    d->tau_unit *= most;
    for (i = 0; i < d->samples * d->forces && most > 0; i++)
        d->tau[i] = (roln_real)((double)d->tau[i] / most);
}

/* Nonzero if all stamps are multiples of a digit. */
static int are_multiples(const motion *d, double digit)
{
    int i = 0;
    while (i < d->samples && fabs(d->t[i] / digit) <= 1e11 && fabs(d->t[i] / digit - floor(d->t[i] / digit + 0.5)) <= 1e-3)
        i++;
    return i == d->samples;
}

/* The largest of 1, 0.1 .. 1e-9 s of which all stamps are multiples, or the last bit of a float of 32 bits that holds the largest
   stamp; 0: none. */
static double digit_of(const motion *d)
{
    double digit = 1, bit, most = 0;
    int power = 0, k, i;
    while (power < 10 && !are_multiples(d, digit))
        power++, digit /= 10;
    if (power == 10) digit = 0;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k]; i < d->first[k + 1]; i++)
            most = fmax(most, fabs(d->t[i] + d->origin[k]));
    frexp(most, &power);
    bit = ldexp(1, power - 24);
    return bit > digit && are_multiples(d, bit) ? bit : digit;
}

/* Nonzero if stamps a_k + b n are within `off` of those of all recordings. */
static int clock_fits(const motion *d, double b, double off, const int *number)
{
    int k, i;
    for (k = 0; k < d->trajectories; k++) {
        double low = HUGE_VAL, high = -HUGE_VAL;
        for (i = d->first[k]; i < d->first[k + 1]; i++)
            low = fmin(low, d->t[i] - b * number[i]), high = fmax(high, d->t[i] - b * number[i]);
        if (high - low > 2 * off) return 0;
    }
    return 1;
}

/* Fits stamps a_k + b n to all recordings, n the number of the sample, missing ones counted, if steps are so long that they can be:
   b and the numbers. Returns nonzero if all stamps are within `off` of it. A step or a rate of three digits is taken if it fits. */
static int fit_clock(const motion *d, pace *p, double off, int *number)
{
    const int blind = p->digit > 0.5 * p->mean; /* stamps too coarse to count missing samples: there are none */
    double xx = 0, xy = 0, power, b;
    int k, i;
    p->missing = 0;
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], n = d->first[k + 1] - a;
        double x = 0, y = 0;
        number[a] = 0;
        for (i = a + 1; i < a + n; i++) {
            const double steps = floor((d->t[i] - d->t[i - 1]) / p->mean + 0.5);
            number[i] = number[i - 1] + (blind || steps < 1 ? 1 : steps < 1e6 ? (int)steps : 1000000);
            if (number[i] > INT_MAX - 1000001) return 0;
        }
        if (n > 1) p->missing += number[a + n - 1] - (n - 1);
        for (i = a; i < a + n; i++)
            x += (double)number[i] / n, y += d->t[i] / n;
        for (i = a; i < a + n; i++)
            xx += (number[i] - x) * (number[i] - x), xy += (number[i] - x) * (d->t[i] - y);
    }
    if (!(xx > 0) || !(xy > 0)) return 0;
    b = p->mean = xy / xx;
    if (!clock_fits(d, b, off, number)) return 0;
    power = pow(10, 2 - floor(log10(b)));
    if (clock_fits(d, floor(b * power + 0.5) / power, off, number)) p->mean = floor(b * power + 0.5) / power;
    else {
        power = pow(10, 2 - floor(log10(1 / b)));
        if (clock_fits(d, power / floor(power / b + 0.5), off, number)) p->mean = power / floor(power / b + 0.5);
    }
    return 1;
}

/* t becomes the clock that was fitted: number [samples]. */
static void set_clock(motion *d, const pace *p, const int *number)
{
    int k, i;
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], n = d->first[k + 1] - a;
        double begin = 0;
        for (i = a; i < a + n; i++)
            begin += (d->t[i] - p->mean * number[i]) / n;
        for (i = a; i < a + n; i++)
            d->t[i] = begin + p->mean * number[i];
    }
}

static const char *const more_digits = "write t with more digits; if rows are equally far apart, count them: t=none dt=0.01 q=2:3, "
                                       "say, as in docs/training.md";

/* The clock of steps that are not even: their median, some samples missing; or any, with stamps that are rounded. */
static void find_clock(motion *d, pace *p, double median)
{
    int *const number = room((size_t)d->samples, sizeof *number);
    pace missing = *p, rounded = *p;
    const double digit = digit_of(d);
    missing.mean = median, rounded.digit = p->digit = digit;
    missing.digit = 0;
    missing.steady = median > 0 && fit_clock(d, &missing, 0.01 * median, number);
    rounded.steady = digit > 0 && fit_clock(d, &rounded, fmax(0.01 * p->mean, 0.55 * digit), number);
    if (missing.steady && (!rounded.steady || d->samples < 20 || 10 * missing.missing <= d->samples)) *p = missing;
    else if (rounded.steady) {
        const double b = rounded.mean, off = 0.55 * digit;
        if (digit > 0.5 * b && (clock_fits(d, 1.01 * b, off, number) || clock_fits(d, 0.99 * b, off, number)))
            fail("%s: t is rounded to %g s, and recordings are so short that their rate is uncertain by more than 1 %%\nhint: %s",
                 d->path, digit, more_digits);
        *p = rounded;
    }
    if (p->steady && fit_clock(d, p, fmax(0.01 * p->mean, 0.55 * p->digit), number)) set_clock(d, p, number);
    free(number);
}

/* What steps of t are like. If those of a clock were rounded, t becomes that clock. */
static pace find_pace(motion *d)
{
    double *step = room((size_t)d->samples, sizeof *step), first, mean = 0, median, sum = 0;
    int steps = 0, off = 0, near = 0, twice = 0, k, i;
    pace p = {0};
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1]; i++)
            step[steps++] = d->t[i] - d->t[i - 1];
    if (steps == 0)
        fail("%s: no sample follows another one: %d samples in %d recordings\nhint: a recording has many rows; a blank line stands "
             "between recordings only",
             d->path, d->samples, d->trajectories);
    first = step[0];
    qsort(step, (size_t)steps, sizeof *step, smaller);
    median = step[steps / 2], p.least = step[0], p.most = step[steps - 1];
    for (i = 0; i < steps; i++) {
        mean += step[i] / steps, off += !same_step(step[i], median), twice += !(step[i] > 0);
        if (step[i] <= 2.5 * median || !(median > 0)) sum += step[i], near++;
    }
    free(step);
    p.even = off == 0, p.mean = p.even ? (fabs(first - mean) <= 1e-6 * mean ? first : mean) : sum / near;
    if (p.mean > 0 && (p.mean < 1e-6 || p.mean > 1e6))
        fail("%s:%d: steps of t are %g s\nhint: t is in seconds, from 1e-6 to 1e6 s apart; else tell its unit by the name of the "
             "column: t_us, say",
             d->file[0], d->line[0], p.mean);
    if (p.even) return p;
    if (p.mean > 0) find_clock(d, &p, median);
    if (!p.steady && 20 * twice > steps)
        fail("%s: %d of %d steps of t are 0; possible cause: too few digits of t\nhint: %s", d->path, twice, steps, more_digits);
    if (!p.steady && !(p.digit > 0.3 * median) && fabs(median - p.mean) < 0.2 * p.mean) p.mean = median;
    return p;
}

/* A number of two digits. */
static double round_number(double x)
{
    const double power = pow(10, floor(log10(x)) - 1);
    return floor(x / power + 0.5) * power;
}

/* A step near the mean one, of one digit if that is as long or somewhat shorter: 10 ms for 10.7, 2 for 2.003. */
static double round_step(double mean)
{
    static const double digits[] = {1, 1.25, 2, 2.5, 4, 5, 8, 10};
    const double power = pow(10, floor(log10(mean * 1.03)));
    size_t i;
    for (i = 0; i < sizeof digits / sizeof *digits; i++)
        if (digits[i] * power >= 0.87 * mean && digits[i] * power <= 1.03 * mean) return digits[i] * power;
    return round_number(mean);
}

/* Seconds from sample i - 1 to i. */
static double step_to(const motion *d, int i)
{
    return d->t ? d->t[i] - d->t[i - 1] : d->dt;
}

/* How far the step of q_j to sample i of trajectory k is from what is expected: dt qd, or, without qd, the step before it or behind
   it, whichever is closer. */
static double rest_of(const motion *d, int by_qd, int k, int i, int j)
{
    const int N = d->N;
    const roln_real *q = d->q + i * N + j;
    const double step = (double)(q[0] - q[-N]), dt = step_to(d, i);
    double before, behind;
    if (by_qd) return step - dt * (double)(d->qd[i * N + j] + d->qd[(i - 1) * N + j]) / 2;
    if (d->first[k + 1] - d->first[k] < 3) return step;
    before = i > d->first[k] + 1 ? step - (double)(q[-N] - q[-2 * N]) * (d->t ? dt / fmax(step_to(d, i - 1), 0.1 * dt) : 1)
                                 : HUGE_VAL;
    behind = i + 1 < d->first[k + 1] ? step - (double)(q[N] - q[0]) * (d->t ? dt / fmax(step_to(d, i + 1), 0.1 * dt) : 1)
                                     : HUGE_VAL;
    return fabs(before) <= fabs(behind) ? before : behind;
}

/* How far steps of a joint are from what is expected: `turn`, more is a turn if it is about one; `jump`, more is a jump. */
typedef struct {
    double turn, jump;
} rests;

/* 20 times the median of joint j, and no jump either: three times what one step in twenty exceeds, twice the finest step of an
   encoder, twice the fastest motion, which an impact turns round. Few steps tell nothing. rest [samples] is scratch. */
static rests rests_of(const motion *d, int by_qd, int j, double *rest)
{
    const int N = d->N;
    double finest = HUGE_VAL, fastest = 0;
    rests most = {0, HUGE_VAL};
    int count = 0, k, i;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1]; i++) {
            const roln_real *q = d->q + i * N + j;
            const double step = (double)(q[0] - q[-N]), next = i + 1 < d->first[k + 1] ? (double)(q[N] - q[0]) : 0;
            const double off = rest_of(d, by_qd, k, i, j);
            const double lasting = step * next > 0 ? fmin(fabs(step), fabs(next)) : 0; /* no wild sample, there and back */
            if (d->t && step_to(d, i) > 1.5 * d->dt) continue;                         /* samples are missing */
            rest[count++] = fabs(off);
            fastest = fmax(fastest, by_qd ? fabs(step - off) : lasting);
            if (step != 0) finest = fmin(finest, fabs(step));
        }
    if (count < 20 || !(fastest > 0)) return most;
    qsort(rest, (size_t)count, sizeof *rest, smaller);
    most.turn = 20 * rest[count / 2];
    most.jump = fmax(fmax(most.turn, 3 * rest[count - 1 - count / 20]), 2 * fmax(finest, fastest));
    return most;
}

/* Nonzero if a step is off from what is expected by whole turns: an encoder that begins anew every turn. */
static int is_turn(double step, double off, double turn)
{
    const double turns = floor(off / turn + 0.5);
    return turns != 0 && fabs(step - off) < turn / 2 && fabs(off - turns * turn) <= 0.1 * turn;
}

/* Says what a jump of joint j to sample i of trajectory k is, and what to do. */
static void refuse_jump(const motion *d, int by_qd, int k, int i, int j)
{
    const double step = (double)(d->q[i * d->N + j] - d->q[(i - 1) * d->N + j]), off = rest_of(d, by_qd, k, i, j);
    const int line = d->line[i];
    if (i + 1 < d->first[k + 1] && fabs(off + rest_of(d, by_qd, k, i + 1, j)) <= 0.2 * fabs(off))
        fail("%s:%d: q of joint %d jumps by %.4g in one sample, and back in the next one; possible cause: a wild sample\nhint: a "
             "blank line in place of the row makes two recordings",
             d->file[k], line, j + 1, step);
    fail("%s:%d: q of joint %d jumps by %.4g in one sample, %s tells %.4g; possible cause: another recording, lost or repeated "
         "samples, a wild sample\nhint: a blank line before it makes two recordings",
         d->file[k], line, j + 1, step, by_qd ? "but its qd" : "but the motion beside it", step - off);
}

/* Steps of q that no motion explains: a joint that is no angle, or an angle in degrees, that begins anew every turn; a wild sample,
   or two recordings without a blank line between them. by_qd: qd tells how it moves. */
static void check_jumps(const motion *d, unsigned angles, int by_qd)
{
    const int N = d->N;
    const double radians = 6.283185307179586;
    double *rest = room((size_t)d->samples, sizeof *rest);
    int k, i, j;
    for (j = 0; j < N; j++) {
        const int angle = j < 32 && angles >> j & 1;
        const rests most = rests_of(d, by_qd, j, rest);
        for (k = 0; k < d->trajectories; k++)
            for (i = d->first[k] + 1; i < d->first[k + 1]; i++) {
                const double step = (double)(d->q[i * N + j] - d->q[(i - 1) * N + j]);
                double off = rest_of(d, by_qd, k, i, j);
                if (d->t && step_to(d, i) > 1.5 * d->dt) continue;
                if (fabs(off) > most.turn && (is_turn(step, off, 360) || (!angle && is_turn(step, off, radians))))
                    fail("%s:%d: q of joint %d jumps by %.4g, as an encoder that begins anew every turn\nhint: %s", d->file[k],
                         d->line[i], j + 1, fabs(step),
                         angle ? "angles are in radians; convert q if it is in degrees"
                               : "ROLN_ANGLES is for a joint that turns round, in radians; else carry its turns on");
                if (angle) off -= radians * floor(off / radians + 0.5);
                if (fabs(off) > most.jump) refuse_jump(d, by_qd, k, i, j);
            }
    }
    free(rest);
}

/* Nonzero if column j of x changes within a recording; and if it is 0 in every sample. */
static int changes(const motion *d, const roln_real *x, int columns, int j)
{
    int k, i;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + 1; i < d->first[k + 1]; i++)
            if (x[i * columns + j] < x[(i - 1) * columns + j] || x[i * columns + j] > x[(i - 1) * columns + j]) return 1;
    return 0;
}

static int is_zero(const motion *d, const roln_real *x, int columns, int j)
{
    int i = 0;
    while (i < d->samples && !(x[i * columns + j] < 0) && !(x[i * columns + j] > 0))
        i++;
    return i == d->samples;
}

/* Warns of columns that never change: the joint stands still, or its encoder is dead. A joint without motor has a torque of 0. */
static void check_constant(const motion *d, const wanted *w)
{
    const char *const force = w->inputs > 0 ? "u" : "tau";
    int zero = 0, j;
    for (j = 0; j < d->N; j++) {
        const int moves = changes(d, d->q, d->N, j), use = d->has_qd && !w->qd_unused, turns = use && changes(d, d->qd, d->N, j);
        if (!moves)
            say("warning: %s: joint %d does not move in any recording: leave it out%s\n", d->path, j + 1,
                turns ? "; possible cause: a dead encoder, for its qd changes" : "");
        else if (use && is_zero(d, d->qd, d->N, j))
            say("warning: %s: joint %d moves, but its qd is 0 in every sample; possible cause: a dead sensor\n", d->path, j + 1);
    }
    for (j = 0; j < d->forces && d->has_tau && w->torque; j++) {
        if (is_zero(d, d->tau, d->forces, j)) zero++, say("%s: %s%d is 0 in every sample\n", d->path, force, j + 1);
        else if (!changes(d, d->tau, d->forces, j))
            say("warning: %s: %s%d does not change in any recording; possible cause: a dead sensor\n", d->path, force, j + 1);
    }
    if (zero == d->forces && !w->driven && !w->like)
        fail("%s: torque=1, but every %s is 0: there is nothing to learn torques from\nhint: record torques that are not 0, or "
             "leave torque=1 out",
             d->path, force);
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

/* Joints that go over more than a turn and are no angles, or over many and are. each: the model has ROLN_SCALE each. */
static void check_turns(const motion *d, unsigned angles, int each)
{
    enum { SAID = 8 };
    int told = 0, i, j;
    for (j = 0; j < d->N; j++) {
        const int angle = j < 32 && angles >> j & 1;
        double low = (double)d->q[j], high = low;
        for (i = 1; i < d->samples; i++)
            low = fmin(low, (double)d->q[i * d->N + j]), high = fmax(high, (double)d->q[i * d->N + j]);
        if (!(high - low > (angle ? 130 : 6.3)) || told++ >= SAID) continue;
        if (angle)
            say("warning: %s: q of joint %d, an angle, goes over %.0f turns; possible cause: it is not in radians\n", d->path,
                   j + 1, (high - low) / 6.283185307179586);
        else
            say("warning: %s: q of joint %d goes from %.3g to %.3g; of a joint that turns round, ROLN_ANGLES learns that; "
                "degrees make gains and torques those of degrees; of a slider nothing is wrong%s\n",
                d->path, j + 1, low, high, each ? "" : ", but beside hinges it asks for ROLN_SCALE each");
    }
    if (told > SAID) say("warning: %s: so do %d more joints\n", d->path, told - SAID);
}

/* ---- 8 velocities ---- */

/* Is one column the derivative of another one, x? Over pieces of a tenth of a second the change of x is the integral of dx/dt,
   however noisy or coarse x is. Correlation of both, their ratio, the mean square of the change, and what ratio may be rounding of
   the integral: of few samples a tenth. */
typedef struct {
    double alike, scale, change, margin;
} likeness;

/* Column c of q.., qd.. */
static double column(const motion *d, int i, int c)
{
    return (double)(c < d->N ? d->q[i * d->N + c] : d->qd[i * d->N + c - d->N]);
}

static likeness compare(const motion *d, int x, int dx)
{
    const int tenth = d->dt < 0.1 ? (int)(0.1 / d->dt + 0.5) : 1;
    double xx = 0, vv = 0, xv = 0;
    likeness l = {0, 0, 0, tenth < 4 ? 1.1 : 1.04};
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

/* qd is not dq/dt: it looks otherwise, or is larger or smaller by more than what noise and the integral explain. */
static int differs(likeness l)
{
    return l.alike < 0.9 || l.scale > l.margin / l.alike || l.scale < l.alike / l.margin;
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
    if (interleaved(d)) return "the columns look like q1, qd1, q2, qd2 .., not all of q, then all of qd";
    if (l.scale == 0) return "a sensor that measures nothing: it is 0 throughout";
    for (k = 0; k < d->N && l.alike < 0.9; k++)
        if (k != j && compare(d, j, d->N + k).alike > 0.95) return "columns in another order: that of another joint is";
    if (l.alike < -0.9) return "the other sign";
    if (l.alike < 0.9) return "noise, another quantity such as tau, or columns in another order";
    if (about(l.scale, 1 / degree)) return "q is in radians, qd in degrees";
    if (about(l.scale, degree)) return "q is in degrees, qd in radians";
    if (about(l.scale, 1 / (6 * degree))) return "q is in radians, qd in revolutions per minute";
    if (about(l.scale, 1000) || about(l.scale, 1e-3)) return "t is in milliseconds, or q and qd are in units a thousand apart";
    if (l.scale > 0.75 && l.scale < 1.33) return "the gain of a sensor, or samples at another rate than t says";
    return "another unit, or a gear between them";
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
        if (w->half == 0) say("%s: qd is 0 throughout, but q moves: qd is taken from q\n", d->path);
        d->has_qd = 0;
    } else if (moving > 0 && longer == moving && d->dt >= 0.2) {
        fail("%s: t grows by %g a sample, and qd is %.0f times dq/dt; possible cause: t is in %s\nhint: divide t by %s, or call "
             "its column %s",
             d->path, d->dt, l[at].scale, l[at].scale < 1e4 ? "milliseconds" : "microseconds",
             l[at].scale < 1e4 ? "1000" : "1000000", l[at].scale < 1e4 ? "t_ms" : "t_us");
    } else if (wrong > 0 && (!w->qd_unused || interleaved(d))) {
        say("warning: %s: qd of %d of %d joints that move is not dq/dt; of joint %d it is %.3g times that, with a correlation "
               "of %.2f; possible cause: %s\n",
               d->path, wrong, moving, at + 1, l[at].scale, l[at].alike, cause_of(d, at, l[at]));
    }
    free(l);
}

/* ---- 9 one rate, one filter ---- */

/* Fills row `to` of e with the local cubic at time `at` of samples a .. b - 1 of d, whose times are t; force: of tau, else of q and
   qd. `exact`: a sample that is there is taken as it is. w [b - a] is scratch. */
static void take_row(const motion *d, int a, int b, const double *t, double at, double half, int exact, int force, motion *e,
                     int to, double *w)
{
    const int n = force ? d->forces : d->N;
    int from, count = kernel_weights(b - a, t, at, half, &from, w), i, j;
    if (exact)
        for (i = 0; i < count; i++)
            if (fabs(t[from + i] - at) <= 0.01 * e->dt) {
                from += i, count = 1, w[0] = 1;
                break;
            }
    for (j = 0; j < n; j++) {
        double x = 0, v = 0;
        for (i = 0; i < count; i++) {
            const size_t row = (size_t)(a + from + i) * (size_t)n + (size_t)j;
            x += w[i] * (double)(force ? d->tau : d->q)[row];
            if (!force) v += w[i] * (double)d->qd[row];
        }
        (force ? e->tau : e->q)[(size_t)to * (size_t)n + (size_t)j] = (roln_real)x;
        if (!force) e->qd[(size_t)to * (size_t)n + (size_t)j] = (roln_real)v;
    }
}

/* Samples a .. b - 1 of d, without gaps, become a recording of e. Returns the number of its samples. */
static int take_part(const motion *d, int a, int b, double half, int exact, motion *e)
{
    const double *const t = d->t + a, cut = e->reach / 2, mean = (t[b - a - 1] - t[0]) / (b - a - 1);
    const double least = 3 * fmax(e->dt, mean), from = t[0] + cut, time = t[b - a - 1] - cut - from;
    const int count = time < 0 ? 0 : (int)(time / e->dt + 1 + 1e-6);
    double *w, *held;
    int i;
    if (count < 2) return 0;
    w = room((size_t)(b - a), sizeof *w), held = room((size_t)(b - a), sizeof *held);
    for (i = 0; i < b - a; i++) /* a force that is held belongs to the middle of its step */
        held[i] = d->measured ? t[i] : i + 1 < b - a ? (t[i] + t[i + 1]) / 2 : t[i] + e->dt / 2;
    for (i = 0; i < count; i++) {
        const double at = from + i * e->dt;
        e->line[e->samples + i] = d->line[a];
        take_row(d, a, b, t, at, fmax(half, least), exact, 0, e, e->samples + i, w);
        if (d->has_tau)
            take_row(d, a, b, held, d->measured ? at : at + e->dt / 2, fmax(half, least), exact && d->measured, 1, e,
                     e->samples + i, w);
    }
    free(w), free(held);
    return count;
}

/* The usual step of recording k: the mean of those up to 2.5 times the median, of all if that is 0. A gap is no part of it. */
static double usual_step(const motion *d, int k)
{
    const int steps = d->first[k + 1] - d->first[k] - 1;
    double *step, sum = 0, median;
    int near = 0, i;
    if (steps < 1) return 0;
    step = room((size_t)steps, sizeof *step);
    for (i = 0; i < steps; i++)
        step[i] = d->t[d->first[k] + i + 1] - d->t[d->first[k] + i];
    qsort(step, (size_t)steps, sizeof *step, smaller);
    median = step[(steps - 1) / 2];
    for (i = 0; i < steps; i++)
        if (step[i] <= 2.5 * median || !(median > 0)) sum += step[i], near++;
    free(step);
    return sum / near;
}

/* The longest step of recording k that is no gap: of its own steps, unless five samples would not fill one. */
static double longest_step(const motion *d, int k, double dt)
{
    const double usual = usual_step(d, k);
    if (usual > GAP * dt && d->first[k + 1] - d->first[k] >= 20)
        fail("%s:%d: steps of t are %.3g s, but in all recordings %.3g s\nhint: t in another unit says so by its name, t_ms say; a "
             "slower rate of all recordings: dt=%.3g",
             d->file[k], d->line[d->first[k]], usual, dt, usual);
    return GAP * (usual > GAP * dt ? dt : fmax(dt, usual));
}

/* Refuses numbers that were finite in the file, and are no longer: at one rate, filtered, as derivatives, with noise. */
static void check_finite(const motion *d)
{
    static const char *const names[] = {"q", "qd", "qdd", "tau", "tau"};
    const roln_real *const of[] = {d->q, d->qd, d->qdd, d->tau, d->tau_mid};
    int kind, i, k = 0;
    for (kind = 0; kind < 5; kind++) {
        const int columns = kind < 3 ? d->N : d->forces;
        for (i = 0; of[kind] && i < d->samples * columns; i++) {
            if (roln_all_finite(1, of[kind] + i)) continue;
            while (d->first[k + 1] <= i / columns)
                k++;
            fail("%s: recording %d: %s %d overflows\nhint: look for a wild number there; a column map takes other units: q=2:7,mm, "
                 "say",
                 d->file[k], k + 1, names[kind], i % columns + 1);
        }
    }
}

/* d at one rate, e->dt = dt: each sample the local cubic of those nearer than `half`, a filter, if that is not 0; then recordings
   lose half of it at both ends, where the filter sees too little of a side. exact: samples at the new times stay as they are. Gaps
   split recordings. */
static motion resampled(const motion *d, double dt, double half, int exact)
{
    motion e = *d;
    double time = 0;
    int k, i, a;
    e.dt = dt, e.reach = half, e.gaps = e.filled = e.short_left = 0, e.apart = 0;
    for (k = 0; k < d->trajectories; k++) {
        const int n = d->first[k + 1] - d->first[k];
        const double all = n > 1 ? d->t[d->first[k + 1] - 1] - d->t[d->first[k]] : 0;
        time += fmin(all / dt, (n - 1) * (longest_step(d, k, dt) / dt)) + 2;
    }
    if (time * fmax(d->N, d->forces) > INT_MAX)
        fail("%s: at steps of %g s there are more than 2^31 numbers\nhint: a longer dt=, or leave recordings out", d->path, dt);
    e.q = e.qd = e.qdd = e.tau = e.tau_mid = NULL, e.first = NULL, e.file = NULL, e.origin = e.t = NULL, e.line = NULL;
    e.samples = e.trajectories = 0;
    make_room(&e, (int)time + d->trajectories);
    for (k = 0; k < d->trajectories; k++) {
        const int begin = d->first[k], end = d->first[k + 1];
        const double limit = longest_step(d, k, dt);
        for (a = i = begin; i < end; i++) {
            int count;
            if (i + 1 < end && d->t[i + 1] - d->t[i] <= limit) continue;
            count = i > a ? take_part(d, a, i + 1, half, exact, &e) : 0;
            if (count == 0) e.short_left += i + 1 - a;
            else {
                e.first[e.trajectories] = e.samples, e.file[e.trajectories] = d->file[k], e.origin[e.trajectories++] = d->origin[k];
                e.samples += count, e.filled += count - (i + 1 - a);
            }
            if (i + 1 < end) e.gaps++, e.apart += d->t[i + 1] - d->t[i];
            a = i + 1;
        }
    }
    e.first[e.trajectories] = e.samples;
    check_finite(&e);
    return e;
}

static void forget(motion *d)
{
    free(d->q), free(d->qd), free(d->tau), free(d->first), free((void *)d->file), free(d->origin), free(d->t), free(d->line);
}

/* Power spectrum of a column, over all recordings: q j, qd j, or tau j, in pieces of n samples; without qd its differences of q.
   Returns the number of pieces. */
static int column_power(const motion *d, int kind, int j, int n, double *power)
{
    static double x[SPECTRUM], re[SPECTRUM], im[SPECTRUM];
    const int columns = kind == OF_TAU ? d->forces : d->N;
    const roln_real *of = (kind == OF_TAU ? d->tau : kind == OF_QD ? d->qd : d->q) + j;
    const int slope = kind == OF_QD && !d->has_qd;
    int pieces = 0, k, a, i;
    if (slope) of = d->q + j;
    for (i = 0; i <= n / 2; i++)
        power[i] = 0;
    for (k = 0; k < d->trajectories; k++)
        for (a = d->first[k] + slope; a + n + slope <= d->first[k + 1]; a += n / 2, pieces++) {
            for (i = 0; i < n; i++)
                x[i] = slope ? (double)(of[(a + i + 1) * columns] - of[(a + i - 1) * columns]) / (2 * d->dt)
                             : (double)of[(a + i) * columns];
            add_power(n, x, power, re, im);
        }
    for (i = 0; i <= n / 2; i++)
        power[i] /= fmax(pieces, 1);
    return pieces;
}

/* What a spectrum says of a column. */
typedef struct {
    double rms;   /* of the noise; 0: none is seen */
    double share; /* of noise in what the trainer needs of the column: qdd, or tau; 0: none is seen */
    double edge;  /* Hz from which on there is no more than eight times the noise */
    double tilt;  /* of the floor: 1 is flat */
} noise_of;

/* Mean square of the derivative that the trainer takes of a column, by central differences; of tau, of itself without its mean. */
static double use_of(const motion *d, int kind, int j)
{
    const int by_q = kind == OF_Q || (kind == OF_QD && !d->has_qd);
    const int columns = kind == OF_TAU ? d->forces : d->N, reach = by_q ? 2 : kind == OF_QD ? 1 : 0;
    const roln_real *of = (kind == OF_TAU ? d->tau : by_q ? d->q : d->qd) + j;
    double sum = 0, mean = 0;
    int count = 0, k, i;
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] + reach; i + reach < d->first[k + 1]; i++) {
            const double x = (double)of[i * columns], b = (double)of[(i + reach) * columns], a = (double)of[(i - reach) * columns];
            const double y = kind == OF_TAU ? x : by_q ? (b - 2 * x + a) / (4 * d->dt * d->dt) : (b - a) / (2 * d->dt);
            mean += y, sum += y * y, count++;
        }
    if (count == 0) return 0;
    return kind == OF_TAU ? sum / count - mean * mean / count / count : sum / count;
}

/* The noise of a column: a floor of the spectrum, from 0.3 to 0.6 of the highest frequency, if it is flat there. */
static noise_of find_noise(const motion *d, int kind, int j, int n)
{
    static double power[SPECTRUM / 2 + 1], sorted[SPECTRUM / 2 + 1];
    const double df = 1 / (n * d->dt), dt = d->dt, half = d->kept && (kind != OF_TAU || d->measured) ? 0 : d->kernel;
    const int low = (int)(0.15 * n), mid = (int)(0.225 * n), high = (int)(0.3 * n), wide = n / 128 + 1;
    noise_of e = {0, 0, 0, 0};
    double floor_of[2], floor_all, variance, use = use_of(d, kind, j), even;
    int pieces, i, k;
    if (!(use > 0) || (pieces = column_power(d, kind, j, n, power)) == 0) return e;
    even = 1.4 + 8 / sqrt((double)(high - low) * pieces); /* what is flat, of so many numbers */
    for (i = 1; i <= high && half > 0; i++)
        power[i] /= pow(kernel_gain(i * df, half), 2);
    for (k = 0; k < 2; k++) {
        const int a = k ? mid : low, b = k ? high : mid;
        for (i = a; i < b; i++)
            sorted[i - a] = power[i];
        qsort(sorted, (size_t)(b - a), sizeof *sorted, smaller);
        floor_of[k] = sorted[(b - a) / 2];
    }
    floor_all = fmin(floor_of[0], floor_of[1]);
    if (!(floor_all > 0) || fmax(floor_of[0], floor_of[1]) > even * floor_all) return e;
    e.tilt = fmax(floor_of[0], floor_of[1]) / floor_all;
    variance = floor_all * n, e.rms = sqrt(variance);
    e.share = sqrt(variance / (kind == OF_TAU ? 1 : kind == OF_QD ? 2 * dt * dt : 8 * dt * dt * dt * dt / 3) / use);
    for (i = 1, k = 1; i < low; i++)
        if (power[i] > power[k]) k = i; /* the peak */
    for (i = k; i < low; i++) {
        double mean = 0;
        int m;
        for (m = i; m < i + wide; m++)
            mean += power[m] / wide;
        if (mean < 8 * floor_all) break;
    }
    e.edge = i * df;
    return e;
}

enum { NOISY = 3 }; /* %, of noise in qdd or tau */

/* Samples of a piece of which spectra are made: at most 8 s, and the longest recording; 0: too few. */
static int piece_length(const motion *d)
{
    int n = SPECTRUM, longest = 0, k;
    for (k = 0; k < d->trajectories; k++)
        longest = d->first[k + 1] - d->first[k] > longest ? d->first[k + 1] - d->first[k] : longest;
    while (n > longest || n * d->dt > 8)
        n /= 2;
    return n < 64 ? 0 : n;
}

/* Writes the noise of all columns to their fields. */
static void measure_noise(const motion *d)
{
    static const noise_of none = {0, 0, 0, 0};
    const int n = piece_length(d);
    int c;
    for (c = 0; c < d->count && n > 0; c++) {
        field *f = &d->fields[c];
        const int is = f->kind == OF_Q || f->kind == OF_TAU || (f->kind == OF_QD && d->has_qd);
        const noise_of e = is ? find_noise(d, f->kind, f->index, n) : none;
        f->noise = e.rms * (f->kind == OF_TAU ? unit_of_tau(d) : 1), f->share = e.share;
    }
}

/* The frequency for the filter, in Hz, 0: none is needed; says why. */
static double choose_filter(const motion *d, const wanted *w)
{
    const double full = KERNEL_BAND / (3 * d->dt);
    const int n = piece_length(d);
    int worst_kind = OF_QD, worst = 0, kind, j;
    double share = 0, edge = 0, hz;
    if (n == 0) return 0;
    for (kind = OF_QD; kind < KINDS; kind++)
        for (j = 0; j < (kind == OF_TAU ? d->forces * (d->has_tau && d->measured && w->torque) : d->N); j++) {
            noise_of e = find_noise(d, kind, j, n);
            if (kind == OF_QD && !d->has_qd) { /* noise of an encoder may be white in q */
                const noise_of of_q = find_noise(d, OF_Q, j, n);
                if (of_q.share > 0 && (!(e.share > 0) || of_q.tilt < e.tilt)) e = of_q;
            }
            edge = fmax(edge, e.edge);
            if (e.share > share) share = e.share, worst_kind = kind, worst = j;
        }
    if (100 * share < NOISY) return 0;
    hz = round_number(edge);
    say("noise is %.2g %% of the %s of %s %d, without filter; it is all that the spectra show above %.3g Hz%s\n", 100 * share,
        worst_kind == OF_TAU ? "torque" : "acceleration", worst_kind == OF_TAU ? "motor" : "joint", worst + 1, hz,
        hz >= full ? ": no filter is wide enough" : "");
    return hz >= full ? 0 : hz;
}

/* q of a joint without qd: its derivative; qdd that of qd. */
static void differentiate(motion *d, const roln_real *x, roln_real *dx)
{
    const int N = d->N;
    double *y = room((size_t)d->samples, sizeof *y);
    int k, i, j;
    for (k = 0; k < d->trajectories; k++)
        for (j = 0; j < N; j++) {
            const int a = d->first[k], n = d->first[k + 1] - a;
            for (i = 0; i < n; i++)
                y[i] = (double)x[(a + i) * N + j];
            for (i = 0; i < n; i++)
                dx[(a + i) * N + j] = (roln_real)derivative(n, y, i, d->dt);
        }
    free(y);
}

/* What a glance at the motion may show, of samples at one rate. */
static void check_motion(motion *d, const wanted *w)
{
    check_turns(d, w->angles, w->each);
    if (d->has_qd) check_velocities(d, w);
    check_constant(d, w);
    if (d->dt >= 0.2 || d->dt < 2e-5)
        say("warning: %s: samples are %g s apart; possible cause: t is not in seconds\n", d->path, d->dt);
}

/* What is said of the new rate. */
static void tell_rate(const motion *d, const motion *e, const pace *p)
{
    double all = 0;
    int k;
    for (k = 0; k < d->trajectories; k++)
        all += d->t[d->first[k + 1] - 1] - d->t[d->first[k]];
    say("time: steps of %.3g .. %.3g ms", 1e3 * p->least, 1e3 * p->most);
    if (p->steady && p->digit > 0.01 * p->mean) say(", a clock of %.6g ms rounded to %.3g ms", 1e3 * p->mean, 1e3 * p->digit);
    else if (p->steady) say(", a clock of %.6g ms", 1e3 * p->mean);
    if (p->steady && p->missing > 0) say(", %d samples missing", p->missing);
    if (e) {
        say("; resampled to %.6g ms (%.4g Hz) by local cubics", 1e3 * e->dt, 1 / e->dt);
        if (e->gaps > 0) say(", split at %d gaps of more than %g steps", e->gaps, GAP);
        if (e->short_left > 0) say(", %d samples left out between gaps", e->short_left);
    }
    say("\n");
    if (e && e->gaps > 3 && 2 * e->apart > all)
        say("warning: %s: gaps take %.0f %% of the time; possible cause: t is when samples were received, in bursts; samples that "
            "are equally far apart can be counted: t=none dt=0.01 q=2:3, say\n",
            d->path, 100 * e->apart / all);
    if (e && 2 * e->short_left > d->samples)
        fail("%s: gaps leave %d of %d samples; possible cause: t is another column, or in another unit\nhint: t=1,ms, say", d->path,
             d->samples - e->short_left, d->samples);
}

/* One rate, one filter, qd where there is none, qdd. The unfiltered motion is checked by `check` before. */
static void settle(motion *d, const wanted *w, const pace *p)
{
    const int ready = p->even || (p->steady && p->missing == 0); /* samples at one rate */
    const double dt = w->dt > 0 ? w->dt : ready || p->steady ? p->mean : round_step(p->mean);
    const int same = ready && fabs(dt - p->mean) <= 1e-4 * p->mean;
    motion even = {0};
    double hz = w->filter > 0 ? w->filter : 0;
    if (dt < 0.5 * p->mean)
        fail("%s: dt=%g, but samples are %.3g s apart\nhint: dt= of at least half of that, or leave it out", d->path, dt, p->mean);
    if (!p->even && same) tell_rate(d, NULL, p);
    d->dt = same ? p->mean : dt;
    if (!same) {
        const int exact = p->steady && fabs(dt - p->mean) <= 1e-4 * p->mean;
        even = resampled(d, dt, 0, exact);
        even.kernel = 3 * fmax(dt, p->mean), even.kept = exact;
        tell_rate(d, &even, p);
        if (even.trajectories == 0) fail("%s: no recording is longer than 2 steps of %g s\nhint: a shorter dt=", d->path, dt);
    }
    check_motion(same ? d : &even, w);
    if (!same && d->has_qd != even.has_qd) d->has_qd = even.has_qd;
    measure_noise(same ? d : &even);
    if (w->half == 0 && w->filter >= 0 && !(hz > 0)) hz = choose_filter(same ? d : &even, w);
    if (hz > 0) {
        const double wide = KERNEL_BAND / hz;
        motion e;
        int i, k;
        for (k = 0; k < d->trajectories && same; k++)
            for (i = d->first[k]; i < d->first[k + 1]; i++)
                d->t[i] = (i - d->first[k]) * dt;
        if (wide < 3 * d->dt)
            fail("%s: filter=%g, but samples every %.3g s allow %.3g Hz at most\nhint: a lower frequency, or filter=off", d->path,
                 hz, d->dt, KERNEL_BAND / (3 * d->dt));
        e = resampled(d, dt, wide, 0);
        if (e.trajectories == 0)
            fail("%s: no recording is longer than the filter of %.3g Hz, %.3g s\nhint: a higher filter=, or filter=off", d->path,
                 hz, wide);
        say("filter: %.3g Hz (-3 dB), zero phase, the same for q%s%s; %.3g s at both ends of recordings are left out\n", hz,
            d->has_qd ? ", qd" : "", d->has_tau ? ", tau" : "", wide / 2);
        if (!same) forget(&even);
        forget(d), *d = e;
    } else if (!same) forget(d), *d = even;
}

/* ---- 10 noise, smoothing ---- */

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

/* qd, if it has yet to come from q; qdd; the forces that belong to them. */
static void finish(motion *d, const wanted *w)
{
    const size_t row = (size_t)d->N * sizeof *d->q;
    const int F = d->forces;
    int k, i;
    d->qdd = room((size_t)d->samples + 1, row);
    d->tau_mid = room((size_t)d->samples + 1, (size_t)(F > d->N ? F : d->N) * sizeof *d->tau);
    if (!d->has_qd && w->half == 0) {
        say("%s: qd is the derivative of q\n", d->path);
        differentiate(d, d->q, d->qd), d->has_qd = d->qd_derived = 1;
    }
    if (d->reach > 0 && d->measured) differentiate(d, d->qd, d->qdd);
    else differences(d, d->qd, d->qdd);
    for (k = 0; k < d->trajectories; k++)
        for (i = d->first[k] * F; i < d->first[k + 1] * F; i++) {
            const int first = i < (d->first[k] + 1) * F, last = i + F >= d->first[k + 1] * F;
            d->tau_mid[i] = d->measured || first ? d->tau[i] : (d->tau[i - F] + d->tau[i]) / 2;
            if (d->measured && !last) d->tau[i] = (d->tau[i] + d->tau[i + F]) / 2;
        }
    check_finite(d);
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
    for (i = 0; i < d->count; i++)
        if (d->fields[i].kind == OF_Q) d->fields[i].noise = hypot(d->fields[i].noise, sd[d->fields[i].index]);
    differences(d, d->q, d->qd);
    differences(d, d->qd, d->qdd);
    check_finite(d);
}

/* Leaves recordings out that have fewer than 2 half + 1 samples. */
static void leave_short_out(motion *d, int half)
{
    int longest = 0, left = 0, parts = 0, to = 0, k, i; /* longest: its number */
    for (k = 1; k < d->trajectories; k++)
        if (d->first[k + 1] - d->first[k] > d->first[longest + 1] - d->first[longest]) longest = k;
    if (d->first[longest + 1] - d->first[longest] <= 2 * half)
        fail("%s:%d: smooth=%d needs %d samples in a recording, the longest has %d\nhint: a smaller smooth=", d->file[longest],
             d->line[d->first[longest]], half, 2 * half + 1, d->first[longest + 1] - d->first[longest]);
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], b = d->first[k + 1];
        if (b - a <= 2 * half) {
            if (left++ == 0)
                say("%s:%d: a recording of %d samples is left out, smooth=%d needs %d", d->file[k], d->line[a], b - a, half,
                    2 * half + 1);
            continue;
        }
        d->first[parts] = to, d->file[parts] = d->file[k], d->origin[parts++] = d->origin[k];
        for (i = a; i < b; i++, to++) {
            move_sample(d, i, to);
            memmove(d->tau_mid + to * d->forces, d->tau_mid + i * d->forces, (size_t)d->forces * sizeof *d->tau_mid);
        }
    }
    if (left > 1) say("; so are %d more\n", left - 1);
    else if (left > 0) say("\n");
    d->first[d->trajectories = parts] = d->samples = to;
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
    leave_short_out(d, half);
    for (k = 0; k < d->trajectories; k++) {
        const int a = d->first[k], b = d->first[k + 1];
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
    check_finite(d);
}

/* ---- 11 recordings ---- */

enum { BLANK, COMMENT, TEXT, SAMPLE };

/* Nonzero if a piece is a number or a time, or begins like one. */
static int begins_sample(char apart, piece w)
{
    stamp t;
    return is_numeric(apart, w) || read_stamp(apart, w, &t);
}

/* Nonzero if text is a comment: it begins like one, and its first piece is no word for a missing number, such as #N/A. */
static int is_comment(const sheet *s, const char *p)
{
    const char apart = s->map ? apart_of(s) : s->apart ? s->apart : separator_of(p);
    if (*p != '#' && *p != '%' && strncmp(p, "//", 2) != 0) return 0;
    return split(apart, p, 1, s->w) == 0 || !is_missing(s->w[0]);
}

/* Returns the kind of a line. TEXT: no piece is a number or begins like one, and one is not empty; before the first sample, the
   first piece is none. */
static int kind_of(const sheet *s)
{
    const char *const p = s->text + strspn(s->text, " \t");
    const char apart = separator_of(s->text);
    const int most = s->most;
    int n, i;
    if (s->text[strspn(s->text, ",; \t")] == 0) return BLANK;
    if (is_comment(s, p)) return COMMENT;
    if (s->map) return is_mapped_sample(s) ? SAMPLE : TEXT;
    n = split(apart, s->text, most, s->w);
    if (s->taken == 0 && n > 0 && s->w[0].n > 0) return begins_sample(apart, s->w[0]) ? SAMPLE : TEXT;
    for (i = 0; i < n && i < most; i++)
        if (is_numeric(apart, s->w[i])) return SAMPLE;
    return TEXT;
}

/* Refuses a line of text where a sample is expected; its first n pieces are in s->w. */
static void refuse_heading(const motion *d, const sheet *s, int n)
{
    piece whole;
    whole.at = s->text, whole.n = (int)strlen(s->text);
    if (n > 1 && is_numeric(separator_of(s->text), s->w[1]))
        fail("%s:%d: column 1: expected a time, found \"%s\"\nhint: seconds, or like 2026-11-25T18:10:05.25", d->path, s->row,
             quoted(s->w[0]));
    fail("%s:%d: expected numbers, found \"%s\"\nhint: %s", d->path, s->row, quoted(whole),
         n > 0 && is_missing(s->w[n - 1])
             ? "a sample is missing: a blank line in place of the row makes two recordings"
             : "a row of units below the header begins with a unit of t: s, ms, us, ns; put # before other text");
}

/* A line of text or a comment: the header, perhaps, or units. Returns nonzero if a recording begins behind it. */
static int read_heading(const motion *d, sheet *s, int comment)
{
    const int had = s->header_row > 0 && !s->comment, most = s->most;
    if ((had || s->named) && is_same(s->text, s->header)) return s->again = 1;
    if (comment && (had || s->taken > 0)) return 0;
    if (!comment && (had || s->taken > 0)) {
        const int n = split(separator_of(s->text), s->text, most, s->w);
        const int names = split(separator_of(s->header), s->header, most, s->name), same = n == names, kept = n < most ? n : most;
        const int last = n > 0 && s->taken == 0 && is_time(s->w[0]) && !is_time(s->name[0]); /* text, then the header */
        const double unit = n > 0 && same ? unit_of(s->w[0]) : 0; /* may stand below each repeated header */
        const double named = same && s->unit <= 0 ? unit_in(s->name[0]) : 0;
        if (unit > 0 && (s->unit <= 0 || s->taken == 0 || s->again || unit == s->unit) && (named <= 0 || named == unit)) {
            keep_units(d, s, s->taken == 0);
            s->unit = unit;
            return 0;
        }
        if ((same && !last && is_header(s->name, names < most ? names : most)) || s->taken > 0)
            refuse_heading(d, s, kept);
        if (n < names && n > 0 && is_time(s->name[0]) && !is_time(s->w[0])) {
            say("%s:%d: text, not a header: line %d has more columns\n", d->path, s->row, s->header_row);
            return 0;
        }
    }
    strcpy(s->header, s->text);
    s->header_row = s->row, s->comment = comment, *s->units = 0;
    return 0;
}

/* Says what was made of t, if it is no plain number of seconds. */
static void tell_time(const motion *d)
{
    const char *const unit = d->unit == 1e-3   ? "milliseconds"
                             : d->unit == 1e-6 ? "microseconds"
                             : d->unit == 1e-9 ? "nanoseconds"
                             : d->unit == 60   ? "minutes"
                                               : "hours";
    if (d->guessed && d->dt >= 0.2)
        fail("%s:%d: if t is in %s since 1970, samples are %g s apart\nhint: tell the unit by the name of the column: t_us, say",
             d->file[0], d->line[0], unit, d->dt);
    if (d->unit != 1) say("%s: t is in %s%s\n", d->path, unit, d->guessed ? " since 1970" : "");
}

/* Refuses a file whose t has a unit other than s, if another file says none, or the other way round. */
static void check_unit_of_t(motion *d, const sheet *s)
{
    const int unit = s->unit_said && s->unit != 1, none = !s->unit_said && !s->guessed;
    if (s->kind != NUMBER || (s->map && s->used[OF_T] == 0)) return;
    if ((unit && d->in_none) || (none && d->in_unit))
        fail("%s:%d: t has %s unit, unlike in %s\nhint: name its unit in all files, t_ms say, or in the map: t=1,ms", d->path,
             s->header_row > 0 ? s->header_row : 1, unit ? "a" : "no", unit ? d->in_none : d->in_unit);
    if (unit && !d->in_unit) d->in_unit = d->path;
    if (none && !d->in_none) d->in_none = d->path;
}

/* Reads a file, behind those that were read before. */
static void read_file(motion *d, const wanted *w, const char *path)
{
    int blank = 1;
    sheet s;
    d->path = path;
    s = open_sheet(d, w);
    s.by_number = w->columns[OF_Q] && is_by_number(w->columns[OF_T]) && is_by_number(w->columns[OF_Q]) &&
                  is_by_number(w->columns[OF_QD]) && is_by_number(w->columns[OF_TAU]);
    while (next_line(path, &s)) {
        const int kind = kind_of(&s);
        progress(path, (double)(s.row - 1) / s.lines);
        if (kind == BLANK) blank = 1, s.separators += strpbrk(s.text, ",;") != NULL;
        else if (kind != SAMPLE)
            blank |= s.map ? read_mapped_heading(d, &s, kind == COMMENT) : read_heading(d, &s, kind == COMMENT);
        else {
            const int before = d->samples;
            if (s.again && *s.units) refuse_units(d, &s);
            s.again = 0;
            if (s.map) add_mapped(d, w, &s);
            else add_sample(d, w, &s);
            if (d->samples == before) continue;
            if (blank) {
                d->first[d->trajectories] = before, d->file[d->trajectories] = path;
                d->origin[d->trajectories++] = (double)s.zero * s.unit;
            }
            blank = 0;
        }
    }
    if (s.separators > 0) say("%s: separators alone in %d lines, which are read as blank lines\n", path, s.separators);
    fclose(s.f);
    if (s.taken == 0)
        fail(
            "%s has no samples\nhint: a CSV has the columns t, q.., qd.., tau.., a line for each sample, which begins with a time; "
            "other columns: q=3:8, say",
            path);
    check_unit_of_t(d, &s);
    if (d->unit <= 0) d->unit = s.unit, d->guessed = s.guessed;
    d->clock |= s.kind == CLOCK;
    free(s.text), free(s.header), free(s.v), free(s.w), free(s.name), free(s.units);
    for (blank = 0; blank < KINDS; blank++)
        free(s.column[blank]), free(s.factor[blank]);
}

/* The columns that are used, with their least and largest numbers. Of many columns the middle ones are left out. */
static void tell_columns(const motion *d, const pace *p)
{
    enum { SHOWN = 40 };
    int c, i;
    say("%s: %d recordings, %d samples\n column  name                  is     unit               from         to\n", d->path,
        d->trajectories, d->samples);
    for (c = 0; c < d->count; c++) {
        const field *f = &d->fields[c];
        const int columns = f->kind == OF_TAU ? d->forces : d->N;
        const roln_real *x = f->kind == OF_T ? NULL : (f->kind == OF_Q ? d->q : f->kind == OF_QD ? d->qd : d->tau) + f->index;
        double low = HUGE_VAL, high = -HUGE_VAL;
        char name[16], column[16], rate[60] = "", called[24];
        if (d->count > SHOWN && c == SHOWN / 2) say("    ...\n");
        if (d->count > SHOWN && c >= SHOWN / 2 && c < d->count - SHOWN / 4) continue;
        for (i = 0; i < d->samples; i++) {
            const double v = x ? (double)x[i * columns] * (f->kind == OF_TAU ? unit_of_tau(d) : 1) : d->t[i];
            low = fmin(low, v), high = fmax(high, v);
        }
        snprintf(name, sizeof name, f->kind == OF_T ? "t" : "%s%d", kind_names[f->kind], f->index + 1);
        snprintf(column, sizeof column, f->column > 0 ? "%d" : "-", f->column);
        if (f->kind == OF_T) snprintf(rate, sizeof rate, "  %.4g Hz%s", 1 / p->mean, f->column > 0 ? "" : ", rows are counted");
        put_short(called, f->name, (int)strlen(f->name), 20);
        say("%7s  %-20s  %-5s  %-12.20s %10.4g %10.4g%s\n", column, called, name,
            f->kind == OF_T ? "s"
            : *f->unit      ? f->unit
                            : "as it is",
            low, high, rate);
    }
    if (d->left_out > 0) say("rows left out, for a number is missing: %d\n", d->left_out);
}

/* Writes the largest torques to their fields. */
static void keep_most(const motion *d)
{
    int c, i;
    for (c = 0; c < d->count; c++) {
        field *f = &d->fields[c];
        for (i = 0; i < d->samples && f->kind == OF_TAU; i++)
            f->most = fmax(f->most, fabs((double)d->tau[i * d->forces + f->index]));
    }
}

/* Reads files and checks them; brings them to one rate, filters noise; qd, if there is none, is the derivative of q, unless q has
   yet to be smoothed; qdd. */
static motion read_recordings(int files, const char *const *paths, const wanted *w)
{
    static char several[64];
    motion d = {0};
    pace p;
    int k, i;
    d.path = paths[0], d.N = w->N, d.forces = w->inputs > 0 ? w->inputs : w->N;
    if (!w->columns[OF_Q] && (w->columns[OF_T] || w->columns[OF_QD] || w->columns[OF_TAU]))
        fail("%s: a column map needs q=\nhint: q=2:3 qd=4:5 tau=6:7, say", d.path);
    if (w->half > 0 && w->filter > 0)
        fail("%s: smooth=%d and filter=%g\nhint: one of them; filter= takes q, qd and tau alike", d.path, w->half, w->filter);
    if (w->like) d.in_unit = w->like->in_unit, d.in_none = w->like->in_none, strcpy(d.noted, w->like->noted);
    for (k = 0; k < files; k++)
        read_file(&d, w, paths[k]);
    snprintf(several, sizeof several, "%d files", files);
    d.path = files > 1 ? several : paths[0];
    d.first[d.trajectories] = d.samples;
    split_restarts(&d);
    drop_repeats(&d);
    drop_wild(&d, w);
    check_unit(&d);
    keep_most(&d);
    p = find_pace(&d);
    d.dt = p.mean;
    if (w->tell) tell_columns(&d, &p);
    tell_time(&d);
    if (p.even) free(d.t), d.t = NULL;
    check_jumps(&d, w->angles, d.has_qd && !w->qd_unused);
    if (w->angles) unwrap(&d, w->angles);
    if (!d.t) {
        d.t = room((size_t)d.samples + 1, sizeof *d.t);
        for (k = 0; k < d.trajectories; k++)
            for (i = d.first[k]; i < d.first[k + 1]; i++)
                d.t[i] = (i - d.first[k]) * d.dt;
    }
    settle(&d, w, &p);
    finish(&d, w);
    return d;
}

#endif
