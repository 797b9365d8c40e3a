/* SPDX-License-Identifier: MIT */
/* recording.h - recorded motion from a CSV file, and what may be wrong with it: the one reader of train.c, range.c and
   tests/mujoco/convert.c.

   A line is a sample: the columns t, q.., qd.., tau..; qd is in units of q per second. A blank line stands between trajectories; a
   header that is repeated begins one, too. tau is held from its sample to the next. For a model with a learned input map
   (ROLN_INPUTS) these columns are its inputs u. Columns may be left out: tau, and, if the positions are smoothed, qd.

   columns  apart by semicolons, tabs, commas or blanks: one of them in a file, in this order of precedence. A comma may be the
            decimal mark if semicolons or tabs stand between columns. Empty columns at the end of a line count for nothing
   numbers  those of C, also 1.5D+00, in quotes or not; not nan, not infinite, no marks between thousands
   t        seconds; other units if the header or a row of units below it says so: t_ms, time [us], "ms;deg;deg"; also seconds,
            milliseconds, microseconds or nanoseconds since 1970; date and time of ISO 8601, or hh:mm:ss
   header   one name a column, or none; lines of text before it, whose first piece is no number and no time, and lines that begin
            with #, % or //, are not read. A name that contradicts the order of columns is refused
   bytes    ASCII or UTF-8, lines that end with LF, CR LF or CR

   For a joint that the model takes for an angle (ROLN_ANGLES), q may jump by turns: it is read without them.

   What would make a training useless ends the program with FILE:LINE, what is wrong, and a hint what to do. What may be meant is a
   warning: qd that is not dq/dt, with the likely cause; a joint that goes over more than a turn, and is no angle of the model.

   1 messages     2 pieces of a line     3 time     4 names     5 samples     6 time stamps     7 velocities
   8 noise, smoothing     9 a recording */

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
    int N, inputs;   /* inputs of a learned input map, 0: none */
    int torque;      /* nonzero: tau is needed */
    int half;        /* samples on each side that positions are smoothed over, 0: not */
    int qd_unused;   /* nonzero: q alone is used */
    unsigned angles; /* bit j: joint j is an angle in radians */
    int each;        /* nonzero: each joint has a unit of its own */
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

/* ---- 2 pieces of a line ---- */

/* The text between two separators, without blanks and quotes around it. */
typedef struct {
    const char *at;
    int n;
} piece;

/* A piece as a message quotes it: 40 bytes at most, no control characters. Two at a time. */
static const char *quoted(piece w)
{
    static char text[2][48];
    static int which;
    char *to = text[which = !which];
    int n = w.n, i;
    if (n > 40)
        for (n = 40; n > 0 && ((unsigned char)w.at[n] & 0xc0) == 0x80;)
            n--; /* not inside a letter of several bytes */
    for (i = 0; i < n; i++)
        to[i] = (char)((unsigned char)w.at[i] < 32 || w.at[i] == 127 ? '?' : w.at[i]);
    strcpy(to + n, w.n > n ? ".." : "");
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

/* The pieces of a line, the first `most` of them into w. Returns how many there are, without empty ones at the end. */
static int split(char apart, const char *p, int most, piece *w)
{
    const char *const blanks = apart == '\t' ? " " : " \t";
    int count = 0, full = 0;
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
        p = end + (*end == apart && apart != ' ');
    }
    return full;
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
    int *line, size;         /* size of text and of header */
    char apart, mark;        /* between columns; in numbers: a point or a comma; 0: none yet */
    int kind;                /* of time stamps */
    long long zero;          /* what is taken from all of them */
    double unit;             /* of t, in s; 0: nothing said */
    int guessed;             /* nonzero: it follows from the size of t alone */
    int header_row, comment; /* where the header stands, 0: none; nonzero: in a comment */
    int named, separators;   /* nonzero: the header names the columns; lines of separators alone */
    double *t, *v;
    piece *w, *name; /* of the line; of the header */
    char *text, *header;
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
        printf("%s: line %d is text: it has another number of columns than line %d\n", d->path, s->header_row, s->row);
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
             ambiguous && w->half > 0 && n == 1 + 2 * N ? "without qd, a header says where they are: t,q1,..,tau1,.."
                                                        : "record them, or leave torque=1 out");
    if (!d->has_qd && w->half == 0)
        fail("%s:%d: no qd columns\nhint: with smooth=10, say, q, qd, qdd come from a parabola through 21 samples of q", d->path,
             row);
}

/* Refuses a header that says q1, qd1, tau1 of columns that are something else. */
static void check_names(const motion *d, const sheet *s, int names)
{
    static const char *const kinds[] = {"t", "q", "qd", "tau"};
    int c;
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

/* Opens a file, counts its lines, and makes room for as many samples. */
static sheet open_sheet(motion *d, const wanted *w)
{
    const size_t row = (size_t)w->N * sizeof(roln_real), most = 2 + 3 * (size_t)w->N;
    sheet s = {0};
    size_t lines;
    s.size = 65536 + 64 * (1 + 3 * w->N);
    s.text = room((size_t)s.size, 1), s.header = room((size_t)s.size, 1), s.v = room(most, sizeof *s.v);
    s.w = room(most, sizeof *s.w), s.name = room(most, sizeof *s.name);
    s.f = fopen(d->path, "rb");
    if (!s.f) fail("cannot read %s\nhint: is the path right, and the file readable?", d->path);
    while (read_text(&s))
        if (s.lines++ == INT_MAX - 1) fail("%s has more than 2^31 lines\nhint: leave recordings out", d->path);
    if (ferror(s.f)) fail("cannot read %s: %s\nhint: is it a file, and whole?", d->path, strerror(errno));
    rewind(s.f);
    if (s.lines == 0) fail("%s is empty\nhint: a CSV has the columns t, q.., qd.., tau..", d->path);
    lines = (size_t)s.lines + 1;
    d->q = room(lines, row), d->qd = room(lines, row), d->qdd = room(lines, row);
    d->tau = room(lines, row), d->tau_mid = room(lines, row), d->first = room(lines, sizeof *d->first);
    s.t = room(lines, sizeof *s.t), s.line = room(lines, sizeof *s.line);
    return s;
}

/* The next line of text, without its end, and without the marks that some programs begin a file with, which stand in the middle of
   files that are put after each other. Returns 0 at the end of the file, which is where it was when lines were counted: there is no
   room for more. */
static int next_line(const char *path, sheet *s)
{
    static const char mark[] = "\xef\xbb\xbf";
    int n = read_text(s);
    if ((n > 0) == (s->row == s->lines))
        fail("%s: %s than when its lines were counted\nhint: the file grew while it was read, or is a pipe: copy it first", path,
             n > 0 ? "longer" : "shorter");
    if (n == 0) return 0;
    s->row++;
    if (memchr(s->text, 0, (size_t)n) ||
        (s->row == 1 && (memcmp(s->text, "\xff\xfe", 2) == 0 || memcmp(s->text, "\xfe\xff", 2) == 0)))
        fail("%s:%d: a byte 0, or a mark of UTF-16, which this text cannot have\nhint: if it is UTF-16, save it as UTF-8; else the "
             "file is damaged, or no text",
             path, s->row);
    if (s->text[n - 1] == '\n') s->text[n - 1] = 0;
    else if (!feof(s->f))
        fail("%s:%d: more than %d letters in a line\nhint: is this a CSV, with a line for each sample?", path, s->row, s->size - 2);
    while (strncmp(s->text, mark, 3) == 0)
        memmove(s->text, s->text + 3, strlen(s->text + 3) + 1);
    return 1;
}

/* Nonzero if a piece is what programs write in place of a number that they do not have. */
static int is_missing(piece w)
{
    static const char *const words[] = {"na", "n/a", "#n/a", "null", "none", "nil", "missing", "-", "--", "?", ".", "<na>"};
    size_t i;
    int k;
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
             w.n > 0 ? "seconds, or like 2026-11-25T18:10:05.25" : mend_of(w));
    }
}

/* The time of a sample, in s, from the first one on if stamps are large. */
static double time_of(const motion *d, sheet *s, piece w)
{
    stamp t;
    read_stamp(s->apart, w, &t);
    if (d->samples == 0) {
        const double size = (double)t.whole + t.rest;
        s->kind = (int)t.kind;
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

/* The first sample tells what the columns are. */
static void begin_samples(motion *d, const wanted *w, sheet *s, int n)
{
    const int most = 2 + 3 * d->N, names = read_names(d, s, n, most);
    columns_are(d, w, s->row, n, names > 0 && names < most ? force_column(s, names) : 0);
    check_names(d, s, names);
    s->named = names > 0;
    if (names > 0 && s->unit <= 0) s->unit = unit_in(s->name[0]);
    s->columns = n;
}

/* The line read last becomes a sample. */
static void add_sample(motion *d, const wanted *w, sheet *s)
{
    const int N = d->N, F = d->forces, most = 2 + 3 * N;
    const double *v = s->v + 1;
    int n, i;
    if (s->apart == 0) s->apart = separator_of(s->text);
    n = split(s->apart, s->text, most, s->w);
    refuse_text(d, s, n < most ? n : most);
    if (s->columns == 0) begin_samples(d, w, s, n);
    if (n != s->columns)
        fail("%s:%d: %d columns, the lines before it have %d\nhint: every sample needs all of its columns", d->path, s->row, n,
             s->columns);
    read_numbers(d, s, n);
    if (d->samples >= INT_MAX / (N > F ? N : F) - 1)
        fail("%s:%d: more than 2^31 numbers\nhint: leave recordings out, or samples: every second one", d->path, s->row);
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

/* ---- 6 time stamps ---- */

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

/* The time stamp of a sample, in s. */
static double stamp_at(const sheet *s, int i)
{
    return s->t[i] + (double)s->zero * s->unit;
}

/* Says what is wrong with the step to sample i, in trajectory k, and what to do; `off` of `steps` steps differ from d->dt. */
static void refuse_step(const motion *d, const sheet *s, int k, int i, int off, int steps)
{
    const double step = s->t[i] - s->t[i - 1], dt = d->dt, missing = step / dt - 1;
    const int length = d->first[k + 1] - d->first[k] - 1, line = s->line[i];
    int alike = 0, j;
    for (j = d->first[k] + 1; j < d->first[k + 1]; j++)
        alike += same_step(s->t[j] - s->t[j - 1], step);
    if (step == 0)
        fail("%s:%d: t stays at %.12g s\nhint: a line written twice, or t with too few digits: write t with more digits", d->path,
             line, stamp_at(s, i));
    if (step < 0)
        fail("%s:%d: t goes back from %.12g to %.12g s\nhint: %s", d->path, line, stamp_at(s, i - 1), stamp_at(s, i),
             s->kind == CLOCK && step < -43200
                 ? "a time of the day begins anew at midnight: write the date, too: 2026-11-25T18:10:05.25"
                 : "a blank line belongs between two trajectories");
    if (2 * alike > length)
        fail("%s:%d: trajectory %d has steps of %g s, most have %g s\nhint: one rate for all: resample it or leave it out", d->path,
             line, k + 1, step, dt);
    if (missing > 0.9 && fabs(missing - floor(missing + 0.5)) < 0.1)
        fail("%s:%d: t grows by %g s, elsewhere by %g s, as if %.0f samples were missing\nhint: a blank line there makes two "
             "trajectories",
             d->path, line, step, dt, missing);
    fail("%s:%d: t grows by %g s, elsewhere by %g s (%d of %d steps differ by more than 1 %%)\nhint: samples at one rate are "
         "needed: "
         "resample, or write t with more digits",
         d->path, line, step, dt, off, steps);
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
    if (steps == 0) fail("%s: no sample follows another one\nhint: a blank line stands between trajectories only", d->path);
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
    if (d->dt < 1e-6 || d->dt > 1e6)
        fail("%s:%d: steps of t are %g s\nhint: t is in seconds, from 1e-6 to 1e6 s apart; else tell its unit by the name of the "
             "column: t_us, say",
             d->path, s->line[0], d->dt);
    free(step);
}

/* How far the step of q_j to sample i of trajectory k is from what is expected: dt qd, or, without qd, the step before it or behind
   it, whichever is closer. */
static double rest_of(const motion *d, int by_qd, int k, int i, int j)
{
    const int N = d->N;
    const roln_real *q = d->q + i * N + j;
    const double step = (double)(q[0] - q[-N]);
    double before, behind;
    if (by_qd) return step - d->dt * (double)(d->qd[i * N + j] + d->qd[(i - 1) * N + j]) / 2;
    if (d->first[k + 1] - d->first[k] < 3) return step;
    before = i > d->first[k] + 1 ? step - (double)(q[-N] - q[-2 * N]) : HUGE_VAL;
    behind = i + 1 < d->first[k + 1] ? step - (double)(q[N] - q[0]) : HUGE_VAL;
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
static void refuse_jump(const motion *d, const sheet *s, int by_qd, int k, int i, int j)
{
    const double step = (double)(d->q[i * d->N + j] - d->q[(i - 1) * d->N + j]), off = rest_of(d, by_qd, k, i, j);
    const int line = s->line[i];
    if (i + 1 < d->first[k + 1] && fabs(off + rest_of(d, by_qd, k, i + 1, j)) <= 0.2 * fabs(off))
        fail("%s:%d: q of joint %d jumps by %.4g in one sample, and back in the next one\nhint: a wild sample: a blank line in "
             "place of "
             "the row makes two recordings",
             d->path, line, j + 1, step);
    fail("%s:%d: q of joint %d jumps by %.4g in one sample, %s tells %.4g\nhint: a blank line before it, if another recording "
         "begins or "
         "samples are lost; possible cause: a wild sample",
         d->path, line, j + 1, step, by_qd ? "but its qd" : "but the motion beside it", step - off);
}

/* Steps of q that no motion explains: a joint that is no angle, or an angle in degrees, that begins anew every turn; a wild sample,
   or two recordings without a blank line between them. by_qd: qd tells how it moves. */
static void check_jumps(const motion *d, const sheet *s, unsigned angles, int by_qd)
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
                if (fabs(off) > most.turn && (is_turn(step, off, 360) || (!angle && is_turn(step, off, radians))))
                    fail("%s:%d: q of joint %d jumps by %.4g, as an encoder that begins anew every turn\nhint: %s", d->path,
                         s->line[i], j + 1, fabs(step),
                         angle ? "in degrees, but angles are in radians: convert them"
                               : "ROLN_ANGLES is for a joint that turns round, in radians; else carry its turns on");
                if (angle) off -= radians * floor(off / radians + 0.5);
                if (fabs(off) > most.jump) refuse_jump(d, s, by_qd, k, i, j);
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
    int j;
    for (j = 0; j < d->N; j++) {
        const int moves = changes(d, d->q, d->N, j), use = d->has_qd && !w->qd_unused, turns = use && changes(d, d->qd, d->N, j);
        if (!moves)
            printf("warning: %s: joint %d does not move in any recording: leave it out%s\n", d->path, j + 1,
                   turns ? "; possible cause: a dead encoder, for its qd changes" : "");
        else if (use && is_zero(d, d->qd, d->N, j))
            printf("warning: %s: joint %d moves, but its qd is 0 in every sample; possible cause: a dead sensor\n", d->path, j + 1);
    }
    for (j = 0; j < d->forces && d->has_tau && w->torque; j++) {
        if (is_zero(d, d->tau, d->forces, j)) printf("%s: %s%d is 0 in every sample\n", d->path, force, j + 1);
        else if (!changes(d, d->tau, d->forces, j))
            printf("warning: %s: %s%d does not change in any recording; possible cause: a dead sensor\n", d->path, force, j + 1);
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
            printf("warning: %s: q of joint %d, an angle, goes over %.0f turns; is it in radians?\n", d->path, j + 1,
                   (high - low) / 6.283185307179586);
        else
            printf("warning: %s: q of joint %d goes from %.3g to %.3g; of a joint that turns round, ROLN_ANGLES learns that; "
                   "degrees make gains and torques those of degrees; of a slider nothing is wrong%s\n",
                   d->path, j + 1, low, high, each ? "" : ", but beside hinges it asks for ROLN_SCALE each");
    }
    if (told > SAID) printf("warning: %s: so do %d more joints\n", d->path, told - SAID);
}

/* ---- 7 velocities ---- */

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
    if (l.scale > 0.75 && l.scale < 1.33) return "the gain of a sensor, or samples at another rate than t says?";
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
            fail("%s: qd is 0 throughout, but q moves\nhint: with smooth=10, say, qd comes from a parabola through 21 samples of q",
                 d->path);
        d->has_qd = 0;
    } else if (moving > 0 && longer == moving && d->dt >= 0.2) {
        fail("%s: t grows by %g a sample, and qd is %.0f times dq/dt: t is in %s\nhint: divide t by %s, or call its column %s",
             d->path, d->dt, l[at].scale, l[at].scale < 1e4 ? "milliseconds" : "microseconds",
             l[at].scale < 1e4 ? "1000" : "1000000", l[at].scale < 1e4 ? "t_ms" : "t_us");
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

/* ---- 8 noise, smoothing ---- */

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
            fail("%s: smooth=%d needs %d samples, trajectory %d has %d\nhint: a smaller smooth=, or leave that trajectory out",
                 d->path, half, 2 * half + 1, k + 1, b - a);
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

/* ---- 9 a recording ---- */

enum { BLANK, COMMENT, TEXT, SAMPLE };

/* Nonzero if a piece is a number or a time, or begins like one. */
static int begins_sample(char apart, piece w)
{
    stamp t;
    return is_numeric(apart, w) || read_stamp(apart, w, &t);
}

/* Returns the kind of a line. TEXT: no piece is a number or begins like one, and one is not empty; before the first sample, the
   first piece is none. */
static int kind_of(const sheet *s, int most, int samples)
{
    const char *const p = s->text + strspn(s->text, " \t");
    const char apart = separator_of(s->text);
    int n, i;
    if (s->text[strspn(s->text, ",; \t")] == 0) return BLANK;
    if (*p == '#' || *p == '%' || strncmp(p, "//", 2) == 0) return COMMENT;
    n = split(apart, s->text, most, s->w);
    if (samples == 0 && n > 0 && s->w[0].n > 0) return begins_sample(apart, s->w[0]) ? SAMPLE : TEXT;
    for (i = 0; i < n && i < most; i++)
        if (is_numeric(apart, s->w[i])) return SAMPLE;
    return TEXT;
}

/* Nonzero if a line is the header again, with a comment mark or blanks around it or without. */
static int is_again(const sheet *s)
{
    const char *a = s->text + strspn(s->text, " \t#%/"), *b = s->header + strspn(s->header, " \t#%/");
    while (*a && *a == *b)
        a++, b++;
    return a[strspn(a, " \t")] == 0 && b[strspn(b, " \t")] == 0;
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
    const int had = s->header_row > 0 && !s->comment, most = 2 + 3 * d->N;
    if ((had || s->named) && is_again(s)) return 1;
    if (comment && (had || d->samples > 0)) return 0;
    if (!comment && (had || d->samples > 0)) {
        const int n = split(separator_of(s->text), s->text, most, s->w);
        const int names = split(separator_of(s->header), s->header, most, s->name), same = n == names;
        const int last = n > 0 && d->samples == 0 && is_time(s->w[0]) && !is_time(s->name[0]); /* text, then the header */
        const double unit = n > 0 && same ? unit_of(s->w[0]) : 0; /* may stand below each repeated header */
        const double named = same && s->unit <= 0 ? unit_in(s->name[0]) : 0;
        if (unit > 0 && (s->unit <= 0 || d->samples == 0 || unit == s->unit) && (named <= 0 || named == unit)) {
            s->unit = unit;
            return 0;
        }
        if ((same && !last && is_header(s->name, names < most ? names : most)) || d->samples > 0)
            refuse_heading(d, s, n < most ? n : most);
        if (n < names && n > 0 && is_time(s->name[0]) && !is_time(s->w[0])) {
            printf("%s: line %d is text: it has fewer columns than line %d\n", d->path, s->row, s->header_row);
            return 0;
        }
    }
    strcpy(s->header, s->text);
    s->header_row = s->row, s->comment = comment;
    return 0;
}

/* Says what was made of t, if it is no plain number of seconds. */
static void tell_time(const motion *d, const sheet *s)
{
    const char *const unit = s->unit == 1e-3   ? "milliseconds"
                             : s->unit == 1e-6 ? "microseconds"
                             : s->unit == 1e-9 ? "nanoseconds"
                             : s->unit == 60   ? "minutes"
                                               : "hours";
    if (s->guessed && d->dt >= 0.2)
        fail("%s:%d: if t is in %s since 1970, samples are %g s apart\nhint: tell the unit by the name of the column: t_us, say",
             d->path, s->line[0], unit, d->dt);
    if (s->unit != 1) printf("%s: t is in %s%s\n", d->path, unit, s->guessed ? " since 1970" : "");
}

/* Reads a file and checks it; qdd are the differences of qd. Without qd it has q alone, which has yet to be smoothed. */
static motion read_recording(const char *path, const wanted *w)
{
    motion d = {0};
    sheet s;
    int blank = 1, k, i;
    d.path = path, d.N = w->N, d.forces = w->inputs > 0 ? w->inputs : w->N;
    s = open_sheet(&d, w);
    while (next_line(path, &s)) {
        const int kind = kind_of(&s, 2 + 3 * w->N, d.samples);
        progress(path, (double)(s.row - 1) / s.lines);
        if (kind == BLANK) blank = 1, s.separators += strpbrk(s.text, ",;") != NULL;
        else if (kind != SAMPLE) blank |= read_heading(&d, &s, kind == COMMENT);
        else {
            if (blank) d.first[d.trajectories++] = d.samples;
            blank = 0;
            add_sample(&d, w, &s);
        }
    }
    if (s.separators > 0) printf("%s: separators alone in %d lines, which are read as blank lines\n", path, s.separators);
    fclose(s.f);
    if (d.samples == 0)
        fail("%s has no samples\nhint: a CSV has the columns t, q.., qd.., tau.., a line for each sample, which begins with a time",
             path);
    d.first[d.trajectories] = d.samples;
    check_time(&d, &s);
    tell_time(&d, &s);
    check_jumps(&d, &s, w->angles, d.has_qd && !w->qd_unused);
    if (w->angles) unwrap(&d, w->angles);
    check_turns(&d, w->angles, w->each);
    if (d.has_qd) check_velocities(&d, w);
    check_constant(&d, w);
    if (d.dt >= 0.2) printf("warning: %s: samples are %g s apart; is t in seconds?\n", path, d.dt);
    differences(&d, d.qd, d.qdd);
    for (k = 0; k < d.trajectories; k++)
        for (i = d.first[k] * d.forces; i < d.first[k + 1] * d.forces; i++)
            d.tau_mid[i] = i < (d.first[k] + 1) * d.forces ? d.tau[i] : (d.tau[i - d.forces] + d.tau[i]) / 2;
    free(s.t), free(s.line), free(s.text), free(s.header), free(s.v), free(s.w), free(s.name);
    return d;
}

#endif
