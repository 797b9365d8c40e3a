/* SPDX-License-Identifier: MIT */
/* held.h - which recordings, or which parts of them, a training is tested with: the setting held= of train.c.

   Everything that is held out stands behind the rest: recordings 0 .. train - 1 are trained with, the others are held out.

       held=0.1    one recording alone, several files or a column map: blocks, spread over all recordings, of a tenth of their time.
                   One file of several recordings in the order t, q, qd, tau: the last tenth of them
       held=b.csv  the recordings of these files; a name is the end of a path, with * for any letters; more of them behind commas;
                   each must fit a file
       held=none   nothing: blocks of a tenth are trained with and tested with

   A block is as long as two looks, and 20 samples at least, or as a tenth of all recordings if that is less. Next to a block the
   filter mixes samples of both sides, so as much of the recording as it sees is used for neither. */

#ifndef HELD_H
#define HELD_H

/* A part of a recording. */
typedef struct {
    int recording, from, to, held; /* samples from .. to - 1 */
} cut;

typedef struct {
    cut *p;
    int count;
} cuts;

static void add_cut(cuts *all, int recording, int from, int to, int held)
{
    cut *p = &all->p[all->count];
    if (to - from < 1) return;
    p->recording = recording, p->from = from, p->to = to, p->held = held;
    all->count++;
}

/* Recordings become these cuts, those that are held out behind the others. Returns how many are trained with. */
static int rebuild(motion *m, const cuts *all)
{
    motion e = *m;
    int trained = 0, samples = 0, held, k, i;
    for (k = 0; k < all->count; k++)
        samples += all->p[k].to - all->p[k].from;
    e.q = e.qd = e.qdd = e.tau = e.tau_mid = NULL, e.first = NULL, e.file = NULL, e.origin = e.t = NULL, e.line = NULL;
    e.samples = e.trajectories = 0;
    make_room(&e, samples + all->count);
    e.qdd = room((size_t)samples + 1, (size_t)m->N * sizeof *e.qdd);
    e.tau_mid = room((size_t)samples + 1, (size_t)(m->forces > m->N ? m->forces : m->N) * sizeof *e.tau_mid);
    for (held = 0; held < 2; held++)
        for (k = 0; k < all->count; k++) {
            const cut *p = &all->p[k];
            const size_t row = (size_t)m->N * sizeof *m->q, forces = (size_t)m->forces * sizeof *m->tau;
            const int n = p->to - p->from, N = m->N, F = m->forces;
            if (p->held != held) continue;
            e.first[e.trajectories] = e.samples, e.file[e.trajectories] = m->file[p->recording];
            e.origin[e.trajectories++] = m->origin[p->recording];
            memcpy(e.q + e.samples * N, m->q + p->from * N, (size_t)n * row);
            memcpy(e.qd + e.samples * N, m->qd + p->from * N, (size_t)n * row);
            memcpy(e.qdd + e.samples * N, m->qdd + p->from * N, (size_t)n * row);
            memcpy(e.tau + e.samples * F, m->tau + p->from * F, (size_t)n * forces);
            memcpy(e.tau_mid + e.samples * F, m->tau_mid + p->from * F, (size_t)n * forces);
            for (i = 0; i < n; i++)
                e.line[e.samples + i] = m->line[p->from + i];
            e.samples += n, trained += !held;
        }
    e.first[e.trajectories] = e.samples;
    free(m->qdd), free(m->tau_mid);
    forget(m);
    *m = e;
    return trained;
}

/* Blocks of `fraction` of the time of all recordings, each `seconds` long if there is room, at equal distances; `margin` samples on
   each side are used for neither. twice: blocks are trained with, too. */
static int hold_blocks(motion *m, double fraction, double seconds, int margin, int twice)
{
    const double all = fraction * m->samples, most = fmax(20, seconds / m->dt);
    const int length = (int)fmax(3, fmin(most, all)), count = (int)fmax(1, floor(all / length + 0.5));
    cuts list = {NULL, 0};
    int block = 0, k;
    list.p = room((size_t)(m->trajectories + 2 * count) + 2, sizeof *list.p);
    for (k = 0; k < m->trajectories; k++) {
        const int a = m->first[k], b = m->first[k + 1];
        int from = a;
        for (; block < count; block++) {
            const int middle = (int)((block + 0.5) * m->samples / count), n = length < b - a ? length : b - a;
            int begin = middle - n / 2, end;
            if (middle >= b) break;
            if (begin > b - n) begin = b - n;
            if (begin < from) begin = from;
            end = begin + n < b ? begin + n : b;
            if (b - end <= margin + 2) end = b; /* what is left is too short to train with */
            if (begin - from <= margin + 2 && from == a) begin = a;
            if (end - begin < 3) continue;
            if (!twice) add_cut(&list, k, from, from < begin ? begin - margin : from, 0);
            add_cut(&list, k, begin, end, 1);
            from = twice ? from : end + (end < b ? margin : 0);
        }
        add_cut(&list, k, from, b, 0);
    }
    k = rebuild(m, &list);
    free(list.p);
    return k;
}

/* Nonzero if a path ends with a name that a pattern fits. */
static int is_named(const char *path, const char *pattern, int length)
{
    const int n = (int)strlen(path);
    int i;
    for (i = 0; i < n; i++)
        if ((i == 0 || path[i - 1] == '/' || path[i - 1] == '\\') && fits(pattern, length, path + i, n - i)) return 1;
    return 0;
}

/* Nonzero if recording k is long enough to be predicted. */
static int is_usable(const motion *m, int k)
{
    return m->first[k + 1] - m->first[k] >= 3;
}

/* The recordings of the files that are named so, by patterns apart by commas, are held out. */
static int hold_files(motion *m, const char *names)
{
    char *const held = room((size_t)m->trajectories + 1, 1);
    cuts list = {NULL, 0};
    int trained, k;
    list.p = room((size_t)m->trajectories + 1, sizeof *list.p);
    while (*names) {
        const int length = (int)strcspn(names, ",");
        int found = 0;
        for (k = 0; k < m->trajectories; k++)
            if (is_named(m->file[k], names, length)) held[k] = 1, found++;
        if (length > 0 && found == 0)
            fail("held=%.*s: no recording is of such a file\nhint: a number, none, or the ends of paths, with * for any letters",
                 length, names);
        names += length + (names[length] == ',');
    }
    for (k = 0; k < m->trajectories; k++)
        add_cut(&list, k, m->first[k], m->first[k + 1], held[k] && is_usable(m, k));
    free(held);
    trained = rebuild(m, &list);
    free(list.p);
    return trained;
}

/* Refuses a recording of 20 samples or more that is there twice: the model would be tested with what it was trained with. */
static void refuse_twins(const motion *m)
{
    const size_t row = (size_t)m->N * sizeof *m->q;
    int a, b, i;
    for (a = 1; a < m->trajectories; a++)
        for (b = 0; b < a; b++) {
            const int n = m->first[a + 1] - m->first[a];
            const roln_real *const q = m->q + m->first[a] * m->N;
            if (n < 20 || m->first[b + 1] - m->first[b] != n) continue;
            if (memcmp(q, m->q + m->first[b] * m->N, (size_t)n * row) != 0) continue;
            for (i = 1; i < n && memcmp(q, q + i * m->N, row) == 0;)
                i++;
            if (i < n) /* it moves */
                fail("%s:%d: the same motion as the recording at %s:%d\nhint: every recording once; held=none permits it",
                     m->file[a], m->line[m->first[a]], m->file[b], m->line[m->first[b]]);
        }
}

/* A part of the usable recordings is held out, the last ones. */
static int hold_last(motion *m, double fraction)
{
    cuts list = {NULL, 0};
    int usable = 0, before, trained, k;
    for (k = 0; k < m->trajectories; k++)
        usable += is_usable(m, k);
    before = usable - (int)ceil(usable * fraction);
    if (usable == m->trajectories) return before;
    list.p = room((size_t)m->trajectories + 1, sizeof *list.p);
    for (k = 0; k < m->trajectories; k++)
        add_cut(&list, k, m->first[k], m->first[k + 1], is_usable(m, k) && before-- <= 0);
    trained = rebuild(m, &list);
    free(list.p);
    return trained;
}

/* Sorts recordings by held=. Returns how many are trained with; look: seconds that are predicted ahead. */
static int hold_out(motion *m, const char *held, double look)
{
    const int margin = (int)ceil(2 * m->reach / m->dt);
    char *end;
    const double fraction = strtod(held, &end);
    if (strcmp(held, "none") == 0) return hold_blocks(m, 0.1, 2 * look, 0, 1);
    refuse_twins(m);
    if (end != held && *end == 0) {
        if (!(fraction >= 0 && fraction <= 1))
            fail("held=%s: expected a number, 0 .. 1\nhint: held=0.1, none, or names of files", held);
        if (m->trajectories > 1 && !m->mapped && strcmp(m->file[0], m->file[m->trajectories - 1]) == 0)
            return hold_last(m, fraction);
        return fraction > 0 && fraction < 1 ? hold_blocks(m, fraction, 2 * look, margin, 0) : fraction > 0 ? 0 : m->trajectories;
    }
    return hold_files(m, held);
}

#endif
