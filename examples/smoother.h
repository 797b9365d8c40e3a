/* SPDX-License-Identifier: MIT */
/* smoother.h - q and qd of recordings where only encoders were recorded: a Kalman smoother on a model that was trained before.

   train.c includes it behind fitted.h.

       read_smoother     the weights of smoother=FILE
       smooth_motion     q, qd, qdd of recordings become those of the smoother

   Forward, NAME_filter_tick on each recording: s_k under all measurements up to k, covariance P_k, and of the step to k + 1,
   without its measurement, s'_k+1, P'_k+1 and A_k of NAME_linear. Backward (Rauch, Tung and Striebel):

       s_k += G_k (s_k+1 - s'_k+1)      G_k = P_k A_k^T P'_k+1^-1

   Noise of the encoders is that of NAME_fit_noise. Unknown torques of each joint are as small as the encoders allow: q may move by
   1.1 times its noise (the discrepancy principle). So a model that is wrong by more trusts the encoders more. Accelerations of
   driven joints count as unknown torques, for differences of encoders are noise. Angles are those next to the measured ones. Cost:
   two filter ticks and a NAME_linear for each sample. */

#ifndef SMOOTHER_H
#define SMOOTHER_H

enum { SMOOTH_SIDE = 2 * M(n) };
#define EXPLAINED 1.1 /* times its noise that q may move */

static struct {
    M(params) p;
    roln_noise noise;
    roln_real q_each[M(N)], tau_each[M(N)];
} smoother;

static void read_smoother(const char *path)
{
    unsigned char *bytes = room(M(packed_size) + 1, 1);
    FILE *f = fopen(path, "rb");
    roln_status st;
    if (!f) fail("smoother=%s: cannot be opened: %s\nhint: OUT.roln of a training of this config", path, strerror(errno));
    st = M(unpack)((int)fread(bytes, 1, M(packed_size) + 1, f), bytes, &smoother.p);
    fclose(f), free(bytes);
    if (st != ROLN_OK)
        fail("smoother=%s: no weights of this config: %s\nhint: OUT.roln of a training of it", path, roln_status_text(st));
}

/* How unknown torques of joints compare: as what accelerates each by the same part of its largest velocity; of a driven joint this
   acceleration itself; NULL behind a chart. */
static roln_real *compare_torques(roln_real *x)
{
    static M(work) scratch;
    M(equation) e;
    M(latent) z = {{0}, {0}};
    int j;
    for (j = 0; j < (int)M(n); j++)
        z.z[j] = (smoother.p.z_min[j] + smoother.p.z_max[j]) / 2;
    if (!JOINTS || M(dynamics)(&smoother.p, &z, &e, &scratch.dynamics) != ROLN_OK) return NULL;
    for (j = 0; j < (int)M(N); j++) {
        const roln_real unit = units_of(&smoother.p) ? units_of(&smoother.p)[j] : 1;
        const int driven = j >= (int)M(N) - (int)M(driven);
        x[j] = smoother.p.zd_max[j] * (driven ? unit : e.M[j * ((int)M(n) + 1)] / unit);
    }
    return x;
}

/* Deviations of encoders and of unknown torques, from at most FILTER_TICKS ticks of m. */
static void fit_smoother(const motion *m)
{
    int *start = room((size_t)m->samples + 1, sizeof *start), k, j;
    roln_batch b = {.steps = WINDOW_TICKS, .stride = 1, .start = start, .q = m->q, .tau = acts() ? m->tau : NULL};
    roln_status st;
    while ((b.count = windows(m, 0, m->trajectories, b.steps, b.steps, 0, start)) == 0 && b.steps > 4)
        b.steps /= 2;
    for (k = 0; k < FILTER_TICKS / WINDOW_TICKS && b.count > FILTER_TICKS / WINDOW_TICKS; k++)
        start[k] = start[(int)((double)k * b.count / (FILTER_TICKS / WINDOW_TICKS))];
    b.count = b.count < FILTER_TICKS / WINDOW_TICKS ? b.count : FILTER_TICKS / WINDOW_TICKS;
    smoother.noise.dt = (roln_real)m->dt, smoother.noise.gate = 0, smoother.noise.lost = 5;
    st = M(fit_noise)(&smoother.p, &b, &smoother.noise, smoother.q_each, compare_torques(smoother.tau_each), &work[0].fit_noise);
    if (st != ROLN_OK)
        fail("smoother=: no noise fits these recordings: %s\nhint: weights of a good training; or leave smoother= out",
             roln_status_text(st));
    for (j = 0; j < (int)M(N) && !smoother.noise.tau_each; j++)
        smoother.tau_each[j] = smoother.noise.tau;
    smoother.noise.tau_each = smoother.tau_each;
    free(start);
}

/* What the way back needs of a sample: the estimate and its covariance, and of the step to the next one the prediction and G. */
typedef struct {
    double s[SMOOTH_SIDE], next[SMOOTH_SIDE], G[SMOOTH_SIDE * SMOOTH_SIDE];
} smoothed;

static void covariance(const M(filter) * f, double *P)
{
    enum { SIDE = M(filtered) };
    int i, j, k;
    for (i = 0; i < SMOOTH_SIDE; i++)
        for (j = 0; j < SMOOTH_SIDE; j++)
            for (P[i * SMOOTH_SIDE + j] = 0, k = 0; k < SIDE; k++)
                P[i * SMOOTH_SIDE + j] += (double)f->F[k * SIDE + i] * (double)f->F[k * SIDE + j];
}

static void estimate(const M(filter) * f, double *x)
{
    int i;
    for (i = 0; i < (int)M(n); i++)
        x[i] = (double)f->s.z[i], x[M(n) + i] = (double)f->s.zd[i];
}

/* G = P A^T P'^-1 by Cholesky of P', scaled to ones on its diagonal. Returns 0 if that is not positive definite. */
static int smoother_gain(const double *P, const roln_real *A, const double *next, double *G)
{
    double L[SMOOTH_SIDE * SMOOTH_SIDE], scale[SMOOTH_SIDE];
    int i, j, k;
    for (i = 0; i < SMOOTH_SIDE; i++)
        scale[i] = sqrt(next[i * (SMOOTH_SIDE + 1)]);
    for (i = 0; i < SMOOTH_SIDE * SMOOTH_SIDE; i++)
        L[i] = next[i] / (scale[i / SMOOTH_SIDE] * scale[i % SMOOTH_SIDE]);
    if (!regression_cholesky(SMOOTH_SIDE, L)) return 0;
    for (i = 0; i < SMOOTH_SIDE; i++) {
        double *g = G + i * SMOOTH_SIDE;
        for (j = 0; j < SMOOTH_SIDE; j++)
            for (g[j] = 0, k = 0; k < SMOOTH_SIDE; k++)
                g[j] += P[i * SMOOTH_SIDE + k] * (double)A[j * SMOOTH_SIDE + k] / scale[j];
        regression_solve(SMOOTH_SIDE, L, g);
        for (j = 0; j < SMOOTH_SIDE; j++)
            g[j] /= scale[j];
    }
    return 1;
}

/* The way forward through samples a .. b - 1 of m. Returns the sample behind the last one that it reached: b, or where the filter
   failed or started again. */
static int smooth_forward(const motion *m, int a, int b, smoothed *at)
{
    enum { F = M(force_size) };
    static M(filter_tick_work) tick;
    static M(linear_work) scratch;
    static M(jacobian) jacobian;
    M(filter) f, ahead;
    double P[SMOOTH_SIDE * SMOOTH_SIDE], next[SMOOTH_SIDE * SMOOTH_SIDE];
    int i;
    memset(&f, 0, sizeof f);
    for (i = a; i < b; i++) {
        const roln_real *tau = i > a && acts() ? m->tau + (i - 1) * F : NULL;
        M(latent) from;
        if (i > a) {
            ahead = f, from = f.s;
            (void)M(filter_tick)(&smoother.p, &smoother.noise, NULL, tau, &ahead, &tick);
            covariance(&f, P), covariance(&ahead, next), estimate(&ahead, at[i - 1 - a].next);
            if (M(linear)(&smoother.p, &from, tau, smoother.noise.dt, &jacobian, &scratch) != ROLN_OK) return i;
            if (!smoother_gain(P, jacobian.A, next, at[i - 1 - a].G)) return i;
        }
        if ((M(filter_tick)(&smoother.p, &smoother.noise, m->q + i * (int)M(N), tau, &f, &tick) &
             (ROLN_FAULT_STATUS | ROLN_FILTER_NONE)) != 0 || f.f.starts > 1)
            return i;
        estimate(&f, at[i - a].s);
    }
    return b;
}

/* z of an angle is within a turn: differences of angles are, too. */
static double smooth_difference(int i, double x)
{
    return i < (int)M(n) && (unsigned)M(angles) >> i & 1 ? remainder(x, 2 * acos(-1.0)) : x;
}

/* The way back, and q, qd. */
static void smooth_back(motion *m, int a, int b, smoothed *at)
{
    enum { N = M(N) };
    static M(work) scratch;
    int i, j, k;
    for (i = b - 1; i >= a; i--) {
        double *best = at[i - a].s, off[SMOOTH_SIDE];
        M(latent) z;
        M(state) x;
        for (j = 0; j < SMOOTH_SIDE && i < b - 1; j++)
            off[j] = smooth_difference(j, at[i + 1 - a].s[j] - at[i - a].next[j]);
        for (j = 0; j < SMOOTH_SIDE && i < b - 1; j++)
            for (k = 0; k < SMOOTH_SIDE; k++)
                best[j] += at[i - a].G[j * SMOOTH_SIDE + k] * off[k];
        for (j = 0; j < (int)M(n); j++)
            z.z[j] = (roln_real)best[j], z.zd[j] = (roln_real)best[M(n) + j];
        if (M(decode)(&smoother.p, &z, &x, &scratch.decode) != ROLN_OK) continue;
        for (j = 0; j < N; j++) {
            const double was = (double)m->q[i * N + j];
            m->q[i * N + j] = (roln_real)(was + smooth_difference(j, (double)x.q[j] - was)), m->qd[i * N + j] = x.qd[j];
        }
    }
}

/* q, qd of recordings from .. to - 1 of m. moved [N] out: rms differences to the q that were recorded. Returns how often the filter
   started again. */
static int smooth_recordings(motion *m, int from, int to, double *moved)
{
    enum { N = M(N) };
    const int first = m->first[from] * N, count = (m->first[to] - m->first[from]) * N;
    roln_real *before = room((size_t)count + 1, sizeof *before);
    int again = 0, k, i;
    memcpy(before, m->q + first, (size_t)count * sizeof *before);
    for (k = from; k < to; k++) {
        smoothed *at = room((size_t)(m->first[k + 1] - m->first[k]) + 1, sizeof *at);
        for (i = m->first[k]; i < m->first[k + 1];) {
            const int end = smooth_forward(m, i, m->first[k + 1], at);
            if (end > i + 1) smooth_back(m, i, end, at);
            i = end > i ? end : i + 1, again += i < m->first[k + 1];
        }
        free(at);
        progress("smoother", (double)(k + 1 - from) / (to - from));
    }
    memset(moved, 0, N * sizeof *moved);
    for (i = 0; i < count; i++)
        moved[i % N] += pow((double)(m->q[first + i] - before[i]), 2) * N / count;
    for (i = 0; i < N; i++)
        moved[i] = sqrt(moved[i]);
    free(before);
    return again;
}

/* Deviations of unknown torques: those of fit_smoother are halved, joint by joint, as long as q moves by what its noise explains.
   For a smaller one the smoother believes the model in place of the encoders. */
static void tune_smoother(motion *m)
{
    enum { N = M(N), ROUNDS = 16, SAMPLES = 8000 };
    const size_t size = (size_t)m->samples * N * sizeof *m->q;
    roln_real *q = room(size + 1, 1), *qd = room(size + 1, 1);
    char done[N] = {0};
    double moved[N];
    int some = 1, round, j, left;
    while (some < m->trajectories && m->first[some] < SAMPLES)
        some++;
    memcpy(q, m->q, size), memcpy(qd, m->qd, size);
    for (round = 0, left = 1; round < ROUNDS && left; round++) {
        for (j = 0; j < N; j++)
            smoother.tau_each[j] *= done[j] ? 1 : ROLN_C(0.5);
        (void)smooth_recordings(m, 0, some, moved);
        memcpy(m->q, q, size), memcpy(m->qd, qd, size);
        for (left = 0, j = 0; j < N; j++) {
            if (!done[j] && moved[j] > EXPLAINED * (double)smoother.noise.q_each[j]) smoother.tau_each[j] *= 2, done[j] = 1;
            left += !done[j];
        }
    }
    free(q), free(qd);
}

/* q, qd, qdd of all recordings of m, of the file or folder `path`. */
static void smooth_motion(motion *m, const char *path)
{
    enum { N = M(N) };
    double moved[N];
    int again, i, j;
    for (i = 0; i < m->samples && (int)M(driven) > 0; i++)
        for (j = N - (int)M(driven); j < N; j++)
            m->tau[i * N + j] = 0;
    fit_smoother(m);
    tune_smoother(m);
    again = smooth_recordings(m, 0, m->trajectories, moved);
    differences(m, m->qd, m->qdd);
    say("%s: a Kalman smoother moves q by", path);
    for (j = 0; j < N; j++)
        encoders[j] = (double)smoother.noise.q_each[j], say("%s %.2g (noise %.2g)", j ? "," : "", moved[j], encoders[j]);
    say(", rms");
    if (again > 0) say("; its filter started again %d times", again);
    say("\n");
}

#endif
