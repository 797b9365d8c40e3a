/* SPDX-License-Identifier: MIT */
/* spread.h - the samples and windows that a step of train.c draws, also from recordings that one process alone has: spread=.

   One process reads and keeps each file of spread=. Together the files may be larger than the memory of a machine. All processes
   hold the other recordings, `d`. These decide the rate, the filter, the units and the first encoder. Tables and held-out
   recordings are of `d` alone.

   Samples have numbers: first those of d, then those of the files of spread=, in their order. All processes know the length of each
   recording, and draw the same numbers. `fetch` sends the samples of a step to all processes.

   File k belongs to lane k % LANES. One process has all files of a lane. It adds their sums for the chart from 0, and all processes
   add the sums of the lanes in their order. So the bits do not depend on the number of processes.

   train.c includes it behind its state and processes.h.

   1 files     2 samples     3 chart and range */

#ifndef SPREAD_H
#define SPREAD_H

/* ---- 1 files ---- */

enum { LANES = 1024 };

typedef struct {
    uint64_t sum;                  /* checksum of q and qd */
    uint64_t torques, bytes;       /* of tau; of the file as it is, 0: it cannot be read again */
    double square;                 /* sum of tau^2, whose unit follows from all files and rounds it */
    int recordings, samples, said; /* said: 1 if there is something to say of it */
} spread_file;

static struct {
    file_list files;
    motion *own;       /* [files]; without samples: another process has it */
    spread_file *file; /* [files] */
    int recordings, samples;
    int *first;             /* [recordings + 1]: the first sample of each, counted from 0 */
    int *begin;             /* [files + 1]: the first recording of each */
    uint64_t sum;           /* checksum of all of them, 0: there are none */
    int ranged;             /* 1: the range is known */
    double low[M(n)], high[M(n)], fastest[M(n)]; /* the range: of z, of |zd| */
} scattered;

/* The process that has file k. */
static int keeper_of(int k)
{
    return k % LANES % processes;
}

/* Adds the files and folders of a list, apart by commas. All processes must find the same ones. */
static void list_spread(const char *names)
{
    uint64_t sum = ROLN_FNV, first;
    int k;
    while (*names) {
        const size_t n = strcspn(names, ",");
        char *name = room(n + 1, 1);
        memcpy(name, names, n);
        if (n > 0) add_files(&scattered.files, name);
        names += n + (names[n] == ',');
    }
    if (scattered.files.count == 0) fail("spread= is empty\nhint: names of files or folders, apart by commas");
    for (k = 0; k < scattered.files.count; k++)
        sum = roln_fnv((int)strlen(scattered.files.path[k]) + 1, (const unsigned char *)scattered.files.path[k], sum);
    first = sum;
    hand_out(0, &first, sizeof first);
    apart = 1;
    if (first != sum) fail("spread=: process %d finds other files than process 0\nhint: a folder that all machines see", process);
    apart = 0;
}

/* Goes on with a checksum and a square over samples from .. to - 1. */
static void add_sum(const motion *m, int from, int to, spread_file *f)
{
    const size_t row = (size_t)m->N * sizeof *m->q, forces = (size_t)m->forces;
    size_t i, j;
    for (i = (size_t)from; i < (size_t)to; i++) {
        f->sum = roln_fnv((int)row, (const unsigned char *)(m->q + i * (size_t)m->N), f->sum);
        f->sum = roln_fnv((int)row, (const unsigned char *)(m->qd + i * (size_t)m->N), f->sum);
        f->torques = roln_fnv((int)(forces * sizeof *m->tau), (const unsigned char *)(m->tau + i * forces), f->torques);
        for (j = i * forces; j < (i + 1) * forces; j++)
            f->square += (double)m->tau[j] * (double)m->tau[j];
    }
    f->samples += to - from;
}

/* Checksum of a file; 0: it cannot be read. */
static uint64_t sum_of_bytes(const char *path)
{
    unsigned char part[4096];
    uint64_t sum = ROLN_FNV;
    size_t count;
    FILE *f = fopen(path, "rb");
    if (!f) return 0;
    while ((count = fread(part, 1, sizeof part, f)) > 0)
        sum = roln_fnv((int)count, part, sum);
    return fclose(f), sum;
}

/* Files of the same bytes count as the same: what their samples become depends on the rates of the files they are read with. */
static int same_file(const spread_file *a, const spread_file *b)
{
    if (a->bytes == b->bytes && a->bytes != 0) return 1;
    return a->sum == b->sum && a->samples == b->samples && fabs(a->square - b->square) <= 1e-4 * a->square;
}

/* Reads file k. Messages about it go to *text. */
static void read_spread_file(int k, const wanted *w, void (*prepare)(motion *m), char **text)
{
    const size_t said = strlen(transcript);
    spread_file *f = &scattered.file[k];
    motion *m = &scattered.own[k];
    *m = read_recordings(1, &scattered.files.path[k], w);
    prepare(m);
    f->recordings = m->trajectories, f->sum = ROLN_FNV, f->bytes = sum_of_bytes(scattered.files.path[k]);
    add_sum(m, 0, m->samples, f);
    if (transcript[said]) {
        f->said = 1, *text = room(strlen(transcript + said) + 1, 1);
        strcpy(*text, transcript + said), transcript[said] = 0;
    }
    free(m->t), free(m->line), m->t = NULL, m->line = NULL;
}

/* Prints the messages about the first files that have any. */
static void tell_spread(char *const *text)
{
    enum { MOST = 10 };
    int told = 0, k;
    for (k = 0; k < scattered.files.count; k++) {
        char said[1000] = "";
        if (!scattered.file[k].said || told++ >= MOST) continue;
        if (text[k]) snprintf(said, sizeof said, "%s", text[k]);
        hand_out(keeper_of(k), said, sizeof said);
        say("spread=, %s:\n%s", scattered.files.path[k], said);
    }
    if (told > MOST) say("spread=: what was said of %d more files is left out\n", told - MOST);
    say("spread=: %d files, %d recordings, %d samples, to train with\n", scattered.files.count, scattered.recordings,
        scattered.samples);
}

/* Sends the lengths of all recordings to all processes. */
static void count_spread(void)
{
    double recordings = 0, samples = d.samples;
    int k, i;
    unite(scattered.file, (size_t)scattered.files.count * sizeof *scattered.file);
    for (k = 0; k < scattered.files.count; k++) {
        recordings += scattered.file[k].recordings, samples += scattered.file[k].samples;
        scattered.sum = roln_fnv((int)sizeof scattered.file[k].square, (const unsigned char *)&scattered.file[k].square,
                                 3 * scattered.sum + scattered.file[k].sum + 5 * scattered.file[k].torques);
    }
    if (samples > INT_MAX - 1)
        fail("spread=: %.0f samples, but there can be %d\nhint: fewer files, or a larger dt=", samples, INT_MAX);
    scattered.recordings = (int)recordings, scattered.samples = (int)(samples - d.samples);
    scattered.first = room((size_t)scattered.recordings + 1, sizeof *scattered.first);
    scattered.begin = room((size_t)scattered.files.count + 1, sizeof *scattered.begin);
    for (k = 0; k < scattered.files.count; k++) {
        const int *first = scattered.own[k].first, at = scattered.begin[k];
        for (i = 0; first && i < scattered.file[k].recordings; i++)
            scattered.first[at + i + 1] = first[i + 1] - first[i];
        scattered.begin[k + 1] = at + scattered.file[k].recordings;
    }
    unite(scattered.first, ((size_t)scattered.recordings + 1) * sizeof *scattered.first);
    for (k = 0; k < scattered.recordings; k++) {
        scattered.first[k + 1] += scattered.first[k];
        scattered.sum = 3 * scattered.sum + (uint64_t)scattered.first[k + 1];
    }
}

/* Refuses a file that is there twice, or is one of d: its held-out part would be trained with. */
static void refuse_spread_twins(void)
{
    spread_file *const own = room((size_t)d.trajectories + 1, sizeof *own);
    int files = 0, a, b;
    for (a = 0; a < d.trajectories; a++) {
        if (a == 0 || d.file[a] != d.file[a - 1]) own[files].bytes = sum_of_bytes(d.file[a]), own[files++].sum = ROLN_FNV;
        add_sum(&d, d.first[a], d.first[a + 1], &own[files - 1]);
    }
    for (a = 0; a < scattered.files.count; a++) {
        const spread_file *f = &scattered.file[a];
        for (b = 0; b < files && !same_file(f, &own[b]); b++)
            ;
        if (b < files)
            fail("spread=: %s has the samples of a file that is read already\nhint: each file once", scattered.files.path[a]);
        for (b = 0; b < a && !same_file(f, &scattered.file[b]); b++)
            ;
        if (b < a)
            fail("spread=: %s and %s have the same samples\nhint: each file once", scattered.files.path[b],
                 scattered.files.path[a]);
    }
    free(own);
}

/* Reads the files of a list, with the columns and the filter of w. `prepare` then changes each as the trainer needs it. */
static void read_spread(const char *names, const wanted *w, void (*prepare)(motion *m))
{
    char **text;
    int k;
    list_spread(names);
    scattered.own = room((size_t)scattered.files.count, sizeof *scattered.own);
    scattered.file = room((size_t)scattered.files.count, sizeof *scattered.file);
    text = room((size_t)scattered.files.count, sizeof *text);
    apart = quiet = 1;
    for (k = 0; k < scattered.files.count; k++)
        if (keeper_of(k) == process) read_spread_file(k, w, prepare, &text[k]);
    apart = quiet = 0;
    count_spread();
    refuse_spread_twins();
    tell_spread(text);
    for (k = 0; k < scattered.files.count; k++)
        free(text[k]);
    free(text);
}

/* ---- 2 samples ---- */

/* Where training samples, steps = 0, or windows may begin: nowhere at the ends, where qdd is one-sided. */
typedef struct {
    const motion *of;
    int *start, *until;         /* [near], in `of`; [recordings of spread=]: how many begin there or before */
    int near, count;            /* near: those in `of`, count: those of spread=, too */
    int steps, stride, fetched; /* fetched: 1 if samples are fetched before they are used */
} pool;

/* Starts in d; with `far` in spread=, too. */
static pool pool_of(int steps, int stride, int far)
{
    pool p = {.of = &d, .steps = steps, .stride = stride, .fetched = far && scattered.files.count > 0};
    p.start = room((size_t)d.samples, sizeof *p.start);
    p.until = room((size_t)scattered.recordings + 1, sizeof *p.until);
    do {
        const int reach = steps > 0 ? p.steps * stride : 1;
        int r;
        p.count = p.near = windows(&d, 0, train, reach, 1, 1, p.start);
        for (r = 0; r < scattered.recordings && p.fetched; r++) {
            const int starts = scattered.first[r + 1] - scattered.first[r] - reach - 1;
            p.count += starts > 0 ? starts : 0, p.until[r] = p.count - p.near;
        }
    } while (p.count == 0 && p.steps-- > 1);
    return p;
}

static void pool_free(pool *p)
{
    free(p->start), free(p->until);
}

/* The first of `count` rising numbers that is above x. */
static int first_above(const int *number, int count, int x)
{
    int low = 0;
    while (count > 0) {
        const int half = count / 2;
        if (number[low + half] > x) count = half;
        else low += half + 1, count -= half + 1;
    }
    return low;
}

/* The number of a sample that is drawn from the pool. */
static int drawn_from(const pool *p, uint64_t *seed)
{
    const int k = roln_randint(p->count, seed);
    int r;
    if (k < p->near) return p->start[k];
    r = first_above(p->until, scattered.recordings, k - p->near);
    return d.samples + scattered.first[r] + 1 + k - p->near - (r > 0 ? p->until[r - 1] : 0);
}

static motion fetched; /* the samples of a step */

/* Copies `length` samples from a number on to place `at` of fetched. Does nothing if another process has them. */
static void fetch_from(int number, int length, int at)
{
    const motion *m = &d;
    const size_t N = M(N), F = (size_t)d.forces, n = (size_t)length, to = (size_t)at;
    size_t i = (size_t)number;
    if (number >= d.samples) {
        const int r = first_above(scattered.first + 1, scattered.recordings, number - d.samples);
        const int file = first_above(scattered.begin + 1, scattered.files.count, r);
        m = &scattered.own[file];
        if (m->samples == 0) return;
        i = (size_t)(number - d.samples - scattered.first[scattered.begin[file]]);
    }
    memcpy(fetched.q + to * N, m->q + i * N, n * N * sizeof *m->q);
    memcpy(fetched.qd + to * N, m->qd + i * N, n * N * sizeof *m->q);
    memcpy(fetched.qdd + to * N, m->qdd + i * N, n * N * sizeof *m->q);
    memcpy(fetched.tau + to * F, m->tau + i * F, n * F * sizeof *m->q);
    memcpy(fetched.tau_mid + to * F, m->tau_mid + i * F, n * F * sizeof *m->q);
}

/* Fills fetched with length[k] samples from number start[k] on, for each k. start[k] becomes their place in fetched. */
static void fetch(int count, int *start, const int *length)
{
    const size_t N = M(N), F = (size_t)d.forces, numbers = 3 * N + 2 * F;
    size_t all = 0;
    int at = 0, k;
    for (k = 0; k < count; k++)
        all += (size_t)length[k];
    if (all > (size_t)fetched.samples)
        free(fetched.q), fetched.q = room(all * numbers, sizeof *fetched.q), fetched.samples = (int)all;
    memset(fetched.q, 0, all * numbers * sizeof *fetched.q);
    fetched.N = M(N), fetched.forces = d.forces, fetched.dt = d.dt;
    fetched.qd = fetched.q + all * N, fetched.qdd = fetched.qd + all * N;
    fetched.tau = fetched.qdd + all * N, fetched.tau_mid = fetched.tau + all * F;
    for (k = 0; k < count; at += length[k++])
        fetch_from(start[k], length[k], at), start[k] = at;
    unite(fetched.q, all * numbers * sizeof *fetched.q);
}

/* ---- 3 chart and range ---- */

#if ROLN_CHARTED
/* Adds the samples of spread= to the sums of d, lane by lane. */
static roln_status add_spread_chart(M(chart) * sums, M(chart_add_work) * work_of)
{
    static M(chart) own, other;
    const int lanes = scattered.files.count < LANES ? scattered.files.count : LANES;
    int lane, p, k, st = ROLN_OK;
    for (lane = 0; lane < lanes; lane += processes) {
        memset(&own, 0, sizeof own);
        for (k = lane + process; lane + process < lanes && k < scattered.files.count && st == ROLN_OK; k += LANES)
            st = (int)M(chart_add)(&s.p, scattered.own[k].samples, scattered.own[k].q, &own, work_of);
        st = agreed(st);
        if (st != ROLN_OK) break;
        for (p = 0; p < processes && lane + p < lanes; p++) {
            if (p == process) other = own;
            hand_out(p, &other, sizeof other);
            M(chart_merge)(&other, sums);
        }
    }
    return (roln_status)st;
}
#endif

/* Widens the range of z_i by another one. Arcs of an angle come to the turn on which they are nearest. Together they are an arc
   whose middle is within -pi .. pi, or all of the circle, as in NAME_fit_range. */
static void join_range(int i, double low, double high, double *to_low, double *to_high)
{
    const roln_lnn *lnn = &M(model).lnn;
    const double pi = 3.14159265358979324;
    double turns = low / 2 + high / 2;
    turns -= (double)roln_lnn_near(lnn, i, (roln_real)(*to_low / 2 + *to_high / 2), (roln_real)turns);
    *to_low = fmin(*to_low, low - turns), *to_high = fmax(*to_high, high - turns);
    if (!roln_lnn_angle(lnn, i)) return;
    turns = *to_low / 2 + *to_high / 2, turns -= (double)roln_lnn_near(lnn, i, 0, (roln_real)turns);
    *to_low -= turns, *to_high -= turns;
    if (!(*to_high - *to_low < 1.9 * pi)) *to_low = -pi, *to_high = pi;
}

/* Finds the range of z and zd over spread=, for the weights in s.p. Nonzero if it overflows. */
static int find_spread_range(void)
{
    enum { n = M(n) };
    static M(params) p;
    static M(fit_range_work) scratch;
    const size_t files = (size_t)scattered.files.count;
    double(*of)[3][n] = room(files + 1, sizeof *of); /* of each file: low z, high z, |zd| */
    int bad = 0, known = 0, k, i;
    for (k = 0; k < scattered.files.count && !bad; k++) {
        const motion *m = &scattered.own[k];
        if (m->samples == 0) continue;
        p = s.p;
        bad = M(fit_range)(&p, m->samples, m->q, m->qd, &scratch) != ROLN_OK;
        for (i = 0; i < n && !bad; i++)
            of[k][0][i] = (double)p.z_min[i], of[k][1][i] = (double)p.z_max[i], of[k][2][i] = (double)p.zd_max[i];
    }
    bad = agreed(bad);
    unite(of, files * sizeof *of);
    for (k = 0; k < scattered.files.count && !bad; k++) {
        if (scattered.file[k].samples == 0) continue;
        for (i = 0; i < n; i++) {
            if (!known) scattered.low[i] = of[k][0][i], scattered.high[i] = of[k][1][i], scattered.fastest[i] = of[k][2][i];
            join_range(i, of[k][0][i], of[k][1][i], &scattered.low[i], &scattered.high[i]);
            scattered.fastest[i] = fmax(scattered.fastest[i], of[k][2][i]);
        }
        known = 1;
    }
    free(of);
    scattered.ranged = known;
    return bad;
}

/* Widens the range in p to that of spread=. After an error in the middle of a training that is not known, and p stays as it is. */
static void widen_range(M(params) * p)
{
    int i;
    for (i = 0; i < (int)M(n) && scattered.ranged; i++) {
        double low = (double)p->z_min[i], high = (double)p->z_max[i];
        join_range(i, scattered.low[i], scattered.high[i], &low, &high);
        p->z_min[i] = (roln_real)low, p->z_max[i] = (roln_real)high;
        p->zd_max[i] = (roln_real)fmax((double)p->zd_max[i], scattered.fastest[i]);
    }
}

#endif
