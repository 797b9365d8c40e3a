/* SPDX-License-Identifier: MIT */
/* range.c - the range of z and zd that recordings reach, for weights that have none: those of import.py.

   cc -std=c99 -O2 -I. -Iexamples -DMODEL=pend16 examples/range.c -o range -lm
   ./range motion.csv .. pend16 [smooth=10] [q=2:7 ..]

   MODEL is the ROLN_NAME of a config header, which is named after it. motion.csv is the motion that the model was trained on,
   read as train.c reads it (recording.h), with the same settings: smooth=, filter=, dt= and the column map. pend16.roln is
   read, and written anew with its range, and so is pend16_weights.h. Without a range a guard calls every state unknown
   (ROLN_FAULT_RANGE). Exit code 0: done; 1: said in the last lines. */
#define NO_THREADS /* no clock but that of C */
#ifndef _WIN32
#define _POSIX_C_SOURCE 200809L
#endif
#include <signal.h>
#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) <m.h>
#define HEADER(m) HEADER_(m)
#include HEADER(MODEL)
#include "recording.h"
#include "files.h"
#include "whole.h"

#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name) /* M(params) is pend16_params */

static M(params) params;
static M(fit_range_work) work;

/* OUT with an ending. */
static FILE *file(const char *out, const char *ending, const char *mode)
{
    static char path[512];
    FILE *f;
    if (strlen(out) > sizeof path - 32) fail("%s: a name of more than %d letters\nhint: a shorter one", out, (int)sizeof path - 32);
    sprintf(path, "%s%s", out, ending);
    f = fopen(path, mode);
    if (!f) fail("cannot %s %s\nhint: is its place right?", *mode == 'r' ? "read" : "write", path);
    return f;
}

/* OUT.part, written, becomes OUT with an ending. */
static void put_in_place(FILE *f, const char *out, const char *ending)
{
    char part[512], whole[512];
    sprintf(part, "%s.part", out), sprintf(whole, "%s%s", out, ending);
    if (!put_whole(f, part, whole)) fail("cannot write %s: %s\nhint: make room, or another place", whole, strerror(errno));
}

static void put(void *f, const char *text)
{
    fputs(text, f);
}

int main(int argc, char **argv)
{
    static unsigned char bytes[M(packed_size) + 1];
    wanted w = {.model = STRING(MODEL), .N = M(N), .inputs = M(inputs), .angles = M(angles), .each = M(own)};
    file_list files = {NULL, 0};
    const char *out = NULL;
    int i;
    motion d;
    FILE *f;
    for (i = 1; i < argc; i++) {
        char *eq = i > 1 ? strchr(argv[i], '=') : NULL, *end;
        if (!eq) {
            if (out) add_files(&files, out);
            out = argv[i];
            continue;
        }
        *eq = 0;
        if (read_key(&w, argv[i], eq + 1)) continue;
        if (strcmp(argv[i], "smooth") != 0)
            fail("unknown setting %s\nhint: smooth=, dt=, filter=, t=, q=, qd= or tau=", argv[i]);
        w.half = (int)strtol(eq + 1, &end, 10), w.qd_unused = 1;
        if (end == eq + 1 || *end || w.half < 1 || w.half > 100000)
            fail("smooth=%s: expected a whole number, 1 .. 100000\nhint: as in the training", eq + 1);
    }
    if (files.count == 0)
        fail("usage: range motion.csv .. NAME [smooth=10] [q=2:7 ..]\nhint: NAME.roln holds the weights; settings are those of "
             "train");
    f = file(out, ".roln", "rb");
    if (M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &params) != ROLN_OK)
        fail("%s.roln: no weights of " STRING(MODEL) "\nhint: is it of this config, and whole?", out);
    fclose(f);
    d = read_recordings(files.count, files.path, &w);
    if (w.half > 0) smooth(&d, w.half);
    (void)add_noise; /* is the trainer's */
    if (M(fit_range)(&params, d.samples, d.q, d.qd, &work) != ROLN_OK)
        fail("%s: the encoder takes it to numbers that are not finite\nhint: are these recordings of this model?", d.path);
#ifdef SIGXFSZ
    signal(SIGXFSZ, SIG_IGN); /* a file that is too large: writing fails */
#endif
    f = file(out, ".part", "w");
    if (M(write)(&params, put, f) != ROLN_OK) fail("%s: a weight that is no C constant\nhint: train it again", out);
    put_in_place(f, out, "_weights.h");
    M(pack)(&params, bytes);
    f = file(out, ".part", "wb");
    fwrite(bytes, M(packed_size), 1, f); /* put_in_place tells */
    put_in_place(f, out, ".roln");
    printf("%s.roln, %s_weights.h: the range of %d samples\n", out, out, d.samples);
    return DONE;
}
