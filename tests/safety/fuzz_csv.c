/* SPDX-License-Identifier: MIT */
/* fuzz_csv.c - recordings: examples/recording.h, the reader of train.c, of a file that is the input behind its first byte, which
   says what the model is like. What is read is at one rate, is finite and stays so. Of even steps of t it has as many samples as
   the file has lines with something in them. What is refused ends the program, here the call, with the file, what is wrong, and a
   hint. */
#include "roln_spd.h"
#include <ctype.h>
#include <limits.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "fuzz.h"

enum { ROOMS = 64 };

static struct {
    const char *text;
    size_t size;
    FILE *f;
    void *room[ROOMS]; /* what was taken of the heap and not given back */
    char said[4096];
    int changed; /* nonzero: samples were resampled, filtered or left out */
    jmp_buf end;
} file;

static FILE *file_open(void)
{
    return file.f = fmemopen((void *)(size_t)(const void *)file.text, file.size, "r");
}

static int file_close(FILE *f)
{
    file.f = NULL;
    return fclose(f);
}

static void *file_room(size_t count, size_t bytes)
{
    int i = 0;
    while (i < ROOMS - 1 && file.room[i])
        i++;
    return file.room[i] = calloc(count, bytes);
}

static void file_free(void *p)
{
    int i;
    for (i = 0; i < ROOMS; i++)
        if (file.room[i] == p) file.room[i] = NULL;
    free(p);
}

static void file_end(int code)
{
    const char *const hint = strstr(file.said, "\nhint: ");
    CLAIM(code == 1 && strncmp(file.said, "file", 4) == 0 && hint && strlen(hint) > 10 && !strchr(hint + 1, '\n'));
    longjmp(file.end, 1);
}

static int file_tell(const char *format, va_list list)
{
    vsnprintf(file.said, sizeof file.said, format, list);
    file.changed |= strstr(file.said, "; resampled") || strncmp(file.said, "filter:", 7) == 0 ||
                    strstr(file.said, "written twice") || strstr(file.said, "left out");
    return 0;
}

static int file_say(const char *format, ...)
{
    va_list list;
    va_start(list, format);
    file_tell(format, list);
    va_end(list);
    return 0;
}

/* The program's hold on the world. */
#define fopen(path, mode) file_open()
#define fclose file_close
#define calloc file_room
#define free file_free
#define exit file_end
#define printf file_say
#define vprintf(format, list) file_tell(format, list)
#define vfprintf(f, format, list) file_tell(format, list)
#define fputc(c, f) ((void)0)
#define fflush(f) ((void)0)
#include "recording.h"
#undef fopen
#undef fclose
#undef calloc
#undef free
#undef exit
#undef printf
#undef vprintf
#undef vfprintf
#undef fputc
#undef fflush

/* Nonzero if a file that is taken has so many samples: lines whose first letter, behind blanks, quotes, a sign and a decimal mark,
   is a digit. A tab in front of it may be a column without text; such a line may be text. */
static int can_be(int samples)
{
    const char *p = file.text, *const behind = p + file.size;
    int count = 0, perhaps = 0;
    while (p < behind) {
        const char *const line = p;
        if (behind - p > 2 && memcmp(p, "\xef\xbb\xbf", 3) == 0) p += 3; /* of a file behind another, too */
        while (p < behind && strchr(" \t\"'", *p))
            p++;
        if (p < behind && (*p == '+' || *p == '-')) p++;
        if (p < behind && (*p == '.' || *p == ',')) p++;
        if (p < behind && isdigit((unsigned char)*p)) *(memchr(line, '\t', (size_t)(p - line)) ? &perhaps : &count) += 1;
        while (p < behind && *p != '\n' && *p != '\r')
            p++;
        p += p < behind;
    }
    return samples >= count && samples <= count + perhaps;
}

static int is_finite(const motion *d)
{
    const int joints = d->samples * d->N, forces = d->samples * d->forces;
    return roln_all_finite(joints, d->q) && roln_all_finite(joints, d->qd) && roln_all_finite(joints, d->qdd) &&
           roln_all_finite(forces, d->tau) && roln_all_finite(forces, d->tau_mid);
}

static void judge(const motion *d, const wanted *w)
{
    const int samples = d->samples;
    int k;
    CLAIM(samples > 1 && d->trajectories >= 1 && d->trajectories <= samples && d->first[0] == 0);
    CLAIM(!memchr(file.text, 0, file.size) && (file.changed || can_be(samples)));
    CLAIM(d->first[d->trajectories] == samples && d->dt >= 1e-6 && d->dt <= 1e6);
    for (k = 0; k < d->trajectories; k++)
        CLAIM(d->first[k] < d->first[k + 1]);
    CLAIM(is_finite(d) && d->N == w->N);
    CLAIM(d->has_tau || !w->torque);
    CLAIM(d->has_qd || w->half > 0);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static motion d;
    static wanted w;
    const unsigned kind = size > 0 ? data[0] : 0;
    int i;
    if (size < 2) return 0;
    memset(&w, 0, sizeof w);
    w.model = "model", w.N = 1 + (int)(kind & 1) * 2, w.inputs = kind & 2 ? 1 : 0, w.torque = kind >> 2 & 1;
    w.half = kind & 8 ? 2 : 0, w.qd_unused = kind >> 4 & 1, w.angles = kind & 32 ? 1 : 0;
    file.text = (const char *)data + 1, file.size = size - 1, file.said[0] = 0, file.changed = 0;
    fuzz_call();
    if (!setjmp(file.end)) {
        double sd[3];
        const char *const name = "file";
        d = read_recordings(1, &name, &w);
        judge(&d, &w);
        if (w.half > 0) smooth(&d, w.half);
        if (kind & 64) add_noise(&d, 0.01, (int)(kind >> 7), 1, sd);
        CLAIM(is_finite(&d));
    }
    if (file.f) file_close(file.f);
    for (i = 0; i < ROOMS; i++)
        if (file.room[i]) file_free(file.room[i]);
    return 0;
}
