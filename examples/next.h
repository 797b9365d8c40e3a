/* SPDX-License-Identifier: MIT */
/* next.h - what to record next: OUT_next.csv, the setting next= of train.c.

   train.c includes it before its stages.

       remember_starts   where recordings start, before blocks of them are held out
       write_next        chooses next= recordings, and writes their starts, with forces all of their samples

   What recordings tell of the weights of the networks is S = sum of J^T J of their rows, of accelerations and torques. Before any
   recording the variance of a weight is the mean square of all weights, in units of the variance of the residuals. A recording adds
   its rows to S. Its gain is log det(I + J S^-1 J^T) / 2 of its rows, the information in nats (docs/math.md, 20).

   A recording is tried as the model predicts it, up to where the model leaves the range of its training. Its start lies where
   recordings start: in the box of their joints; if there are few, in that of all poses. Its torques are those of
   recordings. The best one is chosen, its rows are added to S, and so on. A gain only falls while S grows. So the gains of the
   others are computed again only where they may be the largest.

   With S = U^T U rows become Y = J U^-1, and the gain is log det(I + Y Y^T) / 2. A row x that is added to S changes each other
   row y to (I + x x^T)^-1/2 y. So S is factored once.

   Cost: 8 sums of Gauss-Newton, a Cholesky factor, and for each of TRIED recordings STATES solutions of half of S; memory for S.
   With seconds= a tenth of them is kept for it. When most of that is over, no more are tried.

   1 a recording that could be made     2 what is known     3 choice */

#ifndef NEXT_H
#define NEXT_H

/* ---- 1 a recording that could be made ---- */

enum { TRIED = 200, STATES = 24 }; /* recordings that are tried; states of each that count */
enum { FEW = 10, POSES = 200 };   /* fewer recordings than FEW also start at so many poses of them */

typedef struct {
    M(latent) from;
    int torque[M(force_size) > 0 ? M(force_size) : 1]; /* of each column of tau, its first sample in d */
    int samples;                                       /* that the model predicts in its range */
    roln_real *Y;                                      /* [STATES][P]: its rows J times U^-1, S = U^T U */
    double gain;
    int known; /* Y and gain are those after so many choices */
} proposal;

/* The first samples of all recordings, their box in q and qd and in z and zd, and a recording that plays. */
static struct {
    M(state) *start, least, most;
    int starts;
    M(latent) low, high;
    int samples; /* of the longest recording */
    motion m;    /* q, qd, qdd, tau [samples] */
} played;

static void widen(int count, const roln_real *x, int first, roln_real *low, roln_real *high)
{
    int i;
    for (i = 0; i < count; i++)
        low[i] = first ? x[i] : ROLN_MIN(low[i], x[i]), high[i] = first ? x[i] : ROLN_MAX(high[i], x[i]);
}

/* Copies the first sample of each recording of d, q and qd in its units; of few recordings poses all along, with the first qd.
   Makes room for a recording that plays. Call it before hold_out cuts d into blocks. Without next= it does nothing. */
static void remember_starts(void)
{
    enum { N = M(N) };
    int k;
    if (set("next") == 0) return;
    played.start = room((size_t)d.trajectories + POSES, sizeof *played.start);
    for (k = 0; k < d.trajectories; k++) {
        const int samples = d.first[k + 1] - d.first[k];
        M(state) *x = &played.start[played.starts];
        if (samples < 3) continue;
        played.samples = samples > played.samples ? samples : played.samples;
        memcpy(x->q, d.q + (size_t)d.first[k] * N, sizeof x->q), memcpy(x->qd, d.qd + (size_t)d.first[k] * N, sizeof x->qd);
        played.starts++;
    }
    for (k = 0; k < POSES && played.starts > 0 && d.trajectories < FEW; k++) {
        const int at = (int)((double)k * d.samples / POSES);
        M(state) *x = &played.start[played.starts++];
        memcpy(x->q, d.q + (size_t)at * N, sizeof x->q), memcpy(x->qd, played.start[0].qd, sizeof x->qd);
    }
    played.m.q = room((size_t)played.samples * N, sizeof *d.q), played.m.qd = room((size_t)played.samples * N, sizeof *d.q);
    played.m.qdd = room((size_t)played.samples * N, sizeof *d.q);
    played.m.tau = room((size_t)played.samples * M(force_size) + 1, sizeof *d.q);
}

/* The box of all starts that the model can encode. Returns how many these are. */
static int find_box(void)
{
    enum { N = M(N), n = M(n) };
    static M(encode_work) scratch;
    int k, encoded = 0;
    for (k = 0; k < played.starts; k++) {
        const M(state) *x = &played.start[k];
        M(latent) at;
        if (M(encode)(&s.p, x, &at, &scratch) != ROLN_OK) continue;
        widen(N, x->q, !encoded, played.least.q, played.most.q), widen(N, x->qd, !encoded, played.least.qd, played.most.qd);
        widen(n, at.z, !encoded, played.low.z, played.high.z), widen(n, at.zd, !encoded, played.low.zd, played.high.zd);
        encoded++;
    }
    return encoded;
}

static int is_within(int count, const roln_real *x, const roln_real *low, const roln_real *high)
{
    int i, in = 1;
    for (i = 0; i < count; i++) {
        const roln_real more = ROLN_C(0.05) * (high[i] - low[i]) + ROLN_C(1e-3);
        in &= x[i] >= low[i] - more && x[i] <= high[i] + more;
    }
    return in;
}

/* A start in the box of z, that also is in the box of the joints; if a thousand are not, that of a recording. */
static M(latent) draw_start(void)
{
    enum { N = M(N) };
    static union {
        M(encode_work) encode;
        M(decode_work) decode;
    } scratch;
    M(latent) at;
    M(state) x;
    int tries, i;
    for (tries = 0; tries < 1000; tries++) {
        for (i = 0; i < (int)M(n); i++) {
            at.z[i] = played.low.z[i] + (played.high.z[i] - played.low.z[i]) * roln_uniform(&s.seed);
            at.zd[i] = played.low.zd[i] + (played.high.zd[i] - played.low.zd[i]) * roln_uniform(&s.seed);
        }
        if (M(decode)(&s.p, &at, &x, &scratch.decode) == ROLN_OK && is_within(N, x.q, played.least.q, played.most.q) &&
            is_within(N, x.qd, played.least.qd, played.most.qd))
            return at;
    }
    do
        i = roln_randint(played.starts, &s.seed);
    while (M(encode)(&s.p, &played.start[i], &at, &scratch.encode) != ROLN_OK); /* find_box has met one */
    return at;
}

/* The torques begin where recordings, or blocks of them, begin: all of one, or each of another. If there are few, they begin
   anywhere in the first half. */
static proposal propose(void)
{
    const int mixed = roln_randint(2, &s.seed);
    proposal c = {.from = draw_start()};
    int j;
    for (j = 0; j < (int)M(force_size); j++) {
        const int k = roln_randint(d.trajectories, &s.seed), samples = d.first[k + 1] - d.first[k];
        const int any = d.first[k] + (d.trajectories < FEW ? roln_randint(samples / 2 + 1, &s.seed) : 0);
        c.torque[j] = mixed || j == 0 ? any : c.torque[0];
    }
    return c;
}

/* Samples for which all torques of c last. */
static int lasting(const proposal *c)
{
    int samples = played.samples, j;
    for (j = 0; j < (int)M(force_size) && acts(); j++) {
        const int end = d.first[first_above(d.first + 1, d.trajectories, c->torque[j]) + 1];
        if (end - c->torque[j] < samples) samples = end - c->torque[j];
    }
    return samples;
}

/* The model moves from c->from in `played`, up to where it leaves its range or where a recorded torque ends. */
static void play(proposal *c)
{
    enum { N = M(N), F = M(force_size) };
    static union {
        M(step_work) step;
        M(decode_work) decode;
    } scratch;
    M(latent) now = c->from, before;
    motion *m = &played.m;
    const int samples = lasting(c);
    int i, j;
    for (i = 0; i < samples && (i == 0 || M(in_range)(&s.p, &now)); i++) {
        M(state) x;
        for (j = 0; j < F && acts(); j++)
            m->tau[i * F + j] = d.tau[(size_t)(c->torque[j] + i) * F + (size_t)j];
        if (M(decode)(&s.p, &now, &x, &scratch.decode) != ROLN_OK) break;
        memcpy(m->q + (size_t)i * N, x.q, sizeof x.q), memcpy(m->qd + (size_t)i * N, x.qd, sizeof x.qd);
        before = now;
        if (M(step)(&s.p, &now, acts() ? m->tau + (size_t)i * F : NULL, (roln_real)d.dt, &scratch.step) != ROLN_OK) break;
        for (j = 0; j < (int)M(n); j++) /* angles do not jump by turns */
            now.z[j] = roln_lnn_near(&M(model).lnn, j, before.z[j], now.z[j]);
    }
    c->samples = i;
    for (i = 0; i + 1 < c->samples; i++)
        for (j = 0; j < N; j++)
            m->qdd[i * N + j] = (m->qd[(i + 1) * N + j] - m->qd[i * N + j]) / (roln_real)d.dt;
}

/* ---- 2 what is known ---- */

/* Seconds at the end of a training that the choice takes. */
static double reserve_of_next(void)
{
    return set("next") > 0 ? set("seconds") / 10 : 0;
}

/* S is of some samples. A row of S counts as `weight` of all of them. */
static struct {
    roln_real *S; /* [P][P + 1], with its factor U: S = U^T U */
    roln_real *Y; /* [TRIED][STATES][P] */
    double weight, told[2]; /* told: gains of the first choice and of the last one */
} known;

/* With seconds= what is left is for the choice and the file. */
static int is_late(void)
{
    return halted || left() < reserve_of_next() / 4;
}

static void add_rows(void *ctx, int k, int thread)
{
    enum { P = M(newton_size) };
    static roln_real scratch[THREADS][ROLN_SYM_WORK];
    const double threads = set("threads");
    (void)ctx;
    roln_sym_at(PARTS * PART, P, (int)(P * sqrt(k / threads)), (int)(P * sqrt((k + 1) / threads)), residuals.J, known.S,
                scratch[thread]);
}

/* The factor of S, damped by what is known of a weight before. With too little damping it has none in float. Returns 0 if much more
   does not help. */
static int factor(double damping)
{
    enum { P = M(newton_size), MOST = 16 };
    static roln_real scratch[ROLN_SYM_CHOL_WORK(M(newton_size))], damp[M(newton_size)];
    int tries, k;
    for (tries = 0; tries < MOST; tries++, damping *= 8) {
        for (k = 0; k < P; k++)
            damp[k] = (roln_real)damping;
        if (roln_sym_chol(P, damp, known.S, scratch) == ROLN_OK) return 1;
    }
    return 0;
}

/* What the recordings of d tell, from samples of them. Returns NULL, or why S has no factor. */
static const char *begin_knowledge(void)
{
    enum { P = M(newton_size), DRAWS = 8 };
    static rows f;
    pool samples = pool_of(0, 1, 0), none = {.of = &d};
    double square = 0, of_weights = 1e-30;
    int draws = 0, tries, k;
    known.S = calloc((size_t)P * (P + 1), sizeof *known.S), known.Y = calloc((size_t)TRIED * STATES * P, sizeof *known.Y);
    if (!known.S || !known.Y) return "the networks have more weights than there is memory for";
    known.weight = (double)samples.count / (DRAWS * PARTS * PART);
    f.samples = &samples, f.windows = &none;
    weigh_forces(set("force"));
    for (tries = 0; tries < 2 * DRAWS && draws < DRAWS && !is_late(); tries++) {
        if (!draw(&f, 0)) continue;
        draws++;
        for (k = 0; k < PARTS * PART; k++)
            square += (double)residuals.r[k] * (double)residuals.r[k] / (DRAWS * PARTS * PART);
        share((int)set("threads"), add_rows, NULL);
    }
    for (k = 0; k < P; k++)
        of_weights += (double)s.p.theta[M(newton_from) + k] * (double)s.p.theta[M(newton_from) + k] / P;
    pool_free(&samples);
    if (is_late()) return "there was no time left";
    if (draws < DRAWS) return "residuals of training samples overflow";
    return factor(square / of_weights / known.weight + 1e-30) ? NULL : "the normal equations have no factor";
}

/* c->Y = U^-T times a part of its rows: all rows of U once. */
static void solve_rows(void *ctx, int part, int thread)
{
    enum { P = M(newton_size) };
    const int threads = (int)set("threads");
    proposal *c = ctx;
    int i, j, k;
    (void)thread;
    for (i = 0; i < P; i++) {
        const roln_real *const u = known.S + 1 + (size_t)i * (P + 1);
        for (k = part; k < STATES; k += threads) {
            roln_real *const y = c->Y + (size_t)k * P;
            const roln_real x = y[i] / u[i];
            for (j = i + 1; j < P; j++)
                y[j] -= u[j] * x;
            y[i] = x;
        }
    }
}

/* ---- 3 choice ---- */

/* c->gain = log det(I + Y Y^T) / 2, by a Cholesky factor. */
static void weigh(proposal *c)
{
    enum { P = M(newton_size) };
    double A[STATES][STATES];
    int i, j, k;
    c->gain = 0;
    for (i = 0; i < STATES; i++)
        for (j = 0; j <= i; j++)
            A[i][j] = (double)roln_dot(P, c->Y + (size_t)j * P, c->Y + (size_t)i * P) + (i == j);
    for (i = 0; i < STATES; i++)
        for (j = 0; j <= i; j++) {
            for (k = 0; k < j; k++)
                A[i][j] -= A[i][k] * A[j][k];
            if (i > j) A[i][j] /= A[j][j];
            else if (!(A[i][i] > 0)) return;
            else c->gain += log(A[i][i]) / 2, A[i][i] = sqrt(A[i][i]);
        }
}

/* Rows of STATES states of c, each as long as the samples that it stands for, become c->Y. Its gain stays 0 if there are none. */
static void try_out(proposal *c, roln_real *Y)
{
    enum { P = M(newton_size) };
    const roln_loss of_sample = {.qdd_pred = 1, .force = of_force};
    roln_batch b = {.count = STATES, .stride = 1, .q = played.m.q, .qd = played.m.qd, .qdd = played.m.qdd};
    int start[STATES], k;
    *c = propose(), play(c);
    if (c->samples <= STATES) return;
    for (k = 0; k < STATES; k++)
        start[k] = (int)((k + 0.5) * (c->samples - 1) / STATES);
    b.tau = acts() ? played.m.tau : NULL, b.start = start;
    if (M(rows)(&s.p, &of_sample, &b, 1, 0, 0, &residuals, &work[0].rows) != ROLN_OK) return;
    c->Y = Y;
    for (k = 0; k < STATES * P; k++)
        c->Y[k] = residuals.J[k] * (roln_real)sqrt(c->samples / (STATES * known.weight));
    share((int)set("threads"), solve_rows, c);
    weigh(c);
}

/* y becomes (I + x x^T)^-1/2 y, as x is added to S. */
static void add_row(const roln_real *x, roln_real *y)
{
    enum { P = M(newton_size) };
    const double square = (double)roln_dot(P, x, x);
    const roln_real by = square > 0 ? (roln_real)((1 / sqrt(1 + square) - 1) / square * (double)roln_dot(P, x, y)) : 0;
    int k;
    for (k = 0; k < P; k++)
        y[k] += by * x[k];
}

/* The best of those that are left; NULL: there is none, or a signal came. Its rows are added to S one after the other: each stays
   as those before it have changed it. They change the others when those may be the best one. */
static proposal *choose_next(proposal *all, proposal **chosen, int choices)
{
    enum { P = M(newton_size) };
    for (;;) {
        proposal *best = NULL;
        int i, k;
        for (k = 0; k < TRIED; k++)
            if (all[k].gain > (best ? best->gain : 0)) best = &all[k];
        if (!best || halted) return NULL;
        if (best->known == choices) {
            for (k = 0; k < STATES; k++)
                for (i = k + 1; i < STATES; i++)
                    add_row(best->Y + (size_t)k * P, best->Y + (size_t)i * P);
            return best;
        }
        for (; best->known < choices; best->known++)
            for (k = 0; k < STATES; k++)
                for (i = 0; i < STATES; i++)
                    add_row(chosen[best->known]->Y + (size_t)k * P, best->Y + (size_t)i * P);
        weigh(best);
    }
}

static void put_columns(FILE *f, const roln_real *x, int count)
{
    int i;
    for (i = 0; i < count; i++)
        fprintf(f, ",%.9g", (double)x[i]);
}

/* What `played` holds of c: its start, with forces all samples. */
static void put_proposal(FILE *f, const proposal *c)
{
    enum { N = M(N), F = M(force_size) };
    int i, j;
    for (i = 0; i < (acts() ? c->samples : 1); i++) {
        fprintf(f, "%.9g", i * d.dt);
        put_columns(f, played.m.q + (size_t)i * N, N), put_columns(f, played.m.qd + (size_t)i * N, N);
        for (j = 0; j < F && set("torque") > 0; j++)
            fprintf(f, ",%.9g", j < F - (int)M(driven) ? (double)played.m.tau[i * F + j] : 0.);
        fputs("\n", f);
    }
}

static void put_heading(FILE *f)
{
    const char *const names[] = {"q", "qd", M(inputs) > 0 ? "u" : "tau"};
    int kind, j;
    fputs("t", f);
    for (kind = 0; kind < (set("torque") > 0 ? 3 : 2); kind++)
        for (j = 1; j <= (kind < 2 ? (int)M(N) : (int)M(force_size)); j++)
            fprintf(f, ",%s%d", names[kind], j);
    fputs("\n", f);
}

/* Writes OUT_next.csv, an older one becomes .old, and says how many recordings it has, or why none is chosen. Weights are not
   changed. */
static void write_next(void)
{
    static proposal all[TRIED], *chosen[TRIED];
    const int most = (int)set("next");
    const char *why;
    int tried, count = 0;
    FILE *f = NULL;
    if (most == 0) return;
    keep("_next.csv");
    why = find_box() > 0 ? begin_knowledge() : "no start of a recording can be encoded";
    for (tried = 0; tried < TRIED && !why && !is_late(); tried++)
        try_out(&all[tried], known.Y + (size_t)tried * STATES * M(newton_size)),
            progress("what to record next", (double)tried / TRIED);
    while (count < most && !why && (chosen[count] = choose_next(all, chosen, count)) != NULL) {
        proposal *c = chosen[count];
        if (count == 0 && !(f = file(".part", "w"))) return;
        if (count == 0) put_heading(f);
        else fputs("\n", f);
        play(c), put_proposal(f, c);
        known.told[count++ > 0] = c->gain, c->gain = 0;
    }
    if (count == 0)
        printf("next recordings: none is chosen: %s\n",
               why          ? why
               : is_late()  ? "there was no time left"
               : tried == 0 ? "none was tried"
                            : "the model leaves its range, or the torques end, before 25 samples");
    else if (put_in_place(f, "_next.csv"))
        printf("next recordings: %d of %d that were tried, in %s; the first one tells %.3g nats, the last one %.3g\n", count, tried,
               name_of("_next.csv").text, known.told[0], known.told[count > 1]);
}

#endif
