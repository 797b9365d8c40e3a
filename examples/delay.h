/* SPDX-License-Identifier: MIT */
/* delay.h - how long after its stamp a torque acts: the setting delay= of train.c.

   train.c includes it behind baseline.h. With delay=auto the torques of a small regression (regression.h) are compared with the
   recorded ones, shifted by one time for all motors; the shift of least error is the delay. The regression does not depend on the
   shift, and a shifted torque is a weighted sum of samples. So sums over samples are made once, for every whole lag, and the error
   at any shift follows from them:

       error(shift) = |tau|^2 - b^T (A^T A)^-1 b        b = A^T tau = sum of w_l(shift) A^T tau(lag l)

   - A row of A is the sum of the rows of all samples within DELAY_WIDE, and so is its torque. That leaves little of the noise of
     accelerations, and shifts by parts of a sample make a torque no smoother than shifts by whole ones.
   - If tau is held from its sample to the next, its mean over the two steps beside a sample belongs to the acceleration there. That
     mean is exact for any part of a step. If tau is measured at its time, it is shifted by cubics.
   - Rows are cut into blocks of time. The uncertainty is twice the standard error of the delay, from the delays without one block
     each (jackknife), and a twentieth of a sample.

   A delay that is smaller than its uncertainty, at the end of the range, or hardly better than any other is not used. */

#ifndef DELAY_H
#define DELAY_H

#define DELAY_MOST 0.05 /* s, the range on both sides */
#define DELAY_WIDE 0.03 /* s, of the samples that become one row */
enum {
    DELAY_BLOCKS = 10,
    DELAY_NUMBERS = 160, /* of the regression, at most, if the smallest one has no more */
    DELAY_LAGS = 64,     /* on each side, at most */
    DELAY_TAPS = 4       /* samples of a shifted torque */
};

/* Sums of one block, or of several: A^T A [P][P], lower triangle; A^T tau [lags][P]; tau(lag) tau(lag + k). */
typedef struct {
    double *G, *b, (*square)[DELAY_TAPS];
} delay_sums;

/* The regression, its sums, and the lags that they have. */
typedef struct {
    regression r;
    int held, side, lags, low; /* shifts of -side .. side samples; lags low .. low + lags - 1 */
    int wide, every;           /* samples that become a row; from row to row */
    delay_sums block[DELAY_BLOCKS];
} delay_fit;

static double delay_found; /* s: recordings were shifted by it */

/* Weights w [DELAY_TAPS] of the samples at lags first .. in a torque that acts `shift` samples late. step: its mean over the step
   behind a sample; else what belongs to the acceleration at a sample. Returns first. */
static int delay_weights(int held, int step, double shift, double *w)
{
    const double u = shift - floor(shift);
    const int first = (int)floor(shift);
    memset(w, 0, sizeof *w * DELAY_TAPS);
    if (held && step) w[0] = 1 - u, w[1] = u;
    else if (held) w[0] = (1 - u) / 2, w[1] = 0.5, w[2] = u / 2;
    else {
        w[0] = -u * (u - 1) * (u - 2) / 6, w[1] = (u + 1) * (u - 1) * (u - 2) / 2;
        w[2] = -(u + 1) * u * (u - 2) / 2, w[3] = (u + 1) * u * (u - 1) / 6;
    }
    return held ? first : first - 1;
}

/* ---- sums ---- */

static delay_sums delay_room(const delay_fit *f)
{
    const size_t P = (size_t)f->r.numbers, lags = (size_t)f->lags;
    delay_sums of;
    of.G = room(P * P, sizeof *of.G), of.b = room(lags * P, sizeof *of.b), of.square = room(lags, sizeof *of.square);
    return of;
}

static void delay_free(delay_sums *of)
{
    free(of->G), free(of->b), free(of->square);
}

/* to += sign * s */
static void delay_add(const delay_fit *f, const delay_sums *of, double sign, delay_sums *to)
{
    const size_t P = (size_t)f->r.numbers, lags = (size_t)f->lags;
    size_t i;
    for (i = 0; i < P * P; i++)
        to->G[i] += sign * of->G[i];
    for (i = 0; i < lags * P; i++)
        to->b[i] += sign * of->b[i];
    for (i = 0; i < lags * DELAY_TAPS; i++)
        to->square[i / DELAY_TAPS][i % DELAY_TAPS] += sign * of->square[i / DELAY_TAPS][i % DELAY_TAPS];
}

/* Adds the rows of the samples i .. i + wide - 1. rows: scratch of the regression; A [N][P]. */
static void delay_row(const delay_fit *f, int i, regression_work *rows, double *A, delay_sums *to)
{
    const int N = f->r.joints, P = f->r.numbers;
    const roln_real *recorded = f->held ? d.tau : d.tau_mid;
    double x[4][REGRESSION_JOINTS], tau[2 * DELAY_LAGS + 2 * DELAY_TAPS];
    int n, j, l, k, p;
    memset(A, 0, sizeof *A * (size_t)(N * P));
    for (n = i; n < i + f->wide; n++) {
        baseline_sample(&d, n, x[0], x[1], x[2], x[3]);
        regression_rows(&f->r, x[0], x[1], x[2], rows);
        for (k = 0; k < N * P; k++)
            A[k] += rows->A[k];
    }
    for (j = 0; j < N; j++) {
        double *row = A + j * P;
        for (p = 0; p < P; p++)
            row[p] *= f->r.weight[j];
        for (l = 0; l < f->lags; l++)
            for (tau[l] = 0, n = i; n < i + f->wide; n++)
                tau[l] += f->r.weight[j] * (double)recorded[(n - f->low - l) * N + j];
        for (p = 0; p < P; p++)
            for (k = 0; k <= p && row[p] != 0; k++)
                to->G[(size_t)p * (size_t)P + (size_t)k] += row[p] * row[k];
        for (l = 0; l < f->lags; l++) {
            for (p = 0; p < P; p++)
                to->b[l * P + p] += tau[l] * row[p];
            for (k = 0; k < DELAY_TAPS && l + k < f->lags; k++)
                to->square[l][k] += tau[l] * tau[l + k];
        }
    }
}

/* All sums, of at most two billion multiplications. Returns the number of rows. */
static int delay_sum(delay_fit *f)
{
    const double P = f->r.numbers, cost = (double)d.samples / f->every * f->r.joints * P * (P / 2 + f->lags);
    const int every = f->every * (cost > 2e9 ? (int)ceil(cost / 2e9) : 1);
    regression_work rows = regression_work_new(&f->r);
    double *A = room((size_t)f->r.joints * (size_t)f->r.numbers, sizeof *A);
    int count = 0, k, i;
    for (k = 0; k < DELAY_BLOCKS; k++)
        f->block[k] = delay_room(f);
    for (k = 0; k < d.trajectories; k++)
        for (i = d.first[k] + f->low + f->lags; i + f->wide - f->low < d.first[k + 1]; i += every, count++)
            delay_row(f, i, &rows, A, &f->block[(int)((double)i * DELAY_BLOCKS / d.samples)]);
    regression_work_free(&rows), free(A);
    return count;
}

/* ---- the shift of least error ---- */

/* Error of the torques at a shift in samples, over the torques: L: the factor of G, scale: its inverse norms, x [P] scratch. */
static double delay_error(const delay_fit *f, const delay_sums *of, const double *L, const double *scale, double shift, double *x)
{
    const int P = f->r.numbers;
    double w[DELAY_TAPS], square = 0, explained = 0;
    const int at = delay_weights(f->held, 0, shift, w) - f->low;
    int k, l, p;
    for (p = 0; p < P; p++)
        for (x[p] = 0, k = 0; k < DELAY_TAPS; k++)
            x[p] += w[k] != 0 ? w[k] * scale[p] * of->b[(at + k) * P + p] : 0;
    for (k = 0; k < DELAY_TAPS; k++)
        for (l = k; l < DELAY_TAPS && w[k] != 0; l++)
            square += w[l] != 0 ? (k == l ? 1 : 2) * w[k] * w[l] * of->square[at + k][l - k] : 0;
    for (p = 0; p < P; p++) { /* |L^-1 b|^2 */
        x[p] = (x[p] - regression_dot(p, L + (size_t)p * (size_t)P, x)) / L[(size_t)p * (size_t)P + (size_t)p];
        explained += x[p] * x[p];
    }
    return square > 0 ? fmax(0, 1 - explained / square) : 1;
}

/* The shift of least error in samples, of some sums; least: there, worst: that of the better end. HUGE_VAL: there is none. */
static double delay_least(const delay_fit *f, const delay_sums *of, double *least, double *worst)
{
    const int P = f->r.numbers;
    double *L = room((size_t)P * (size_t)P, sizeof *L), *scale = room((size_t)P, sizeof *scale), *x = room((size_t)P, sizeof *x);
    double best = HUGE_VAL, low, high, ends[2];
    int p, k;
    *least = HUGE_VAL;
    for (p = 0; p < P; p++) {
        const double g = of->G[(size_t)p * (size_t)P + (size_t)p];
        scale[p] = g > 0 ? 1 / sqrt(g) : 0;
        for (k = 0; k <= p; k++)
            L[(size_t)p * (size_t)P + (size_t)k] = scale[p] * scale[k] * of->G[(size_t)p * (size_t)P + (size_t)k];
        L[(size_t)p * (size_t)P + (size_t)p] += g > 0 ? 1e-6 : 1;
    }
    if (regression_cholesky(P, L)) {
        for (k = -2 * f->side; k <= 2 * f->side; k++) {
            const double e = delay_error(f, of, L, scale, 0.5 * k, x);
            if (e < *least) *least = e, best = 0.5 * k;
        }
        low = fmax(best - 0.5, -f->side), high = fmin(best + 0.5, f->side);
        while (high - low > 1e-4) {
            const double a = low + (high - low) / 3, b = high - (high - low) / 3;
            if (delay_error(f, of, L, scale, a, x) < delay_error(f, of, L, scale, b, x)) high = b;
            else low = a;
        }
        best = (low + high) / 2, *least = delay_error(f, of, L, scale, best, x);
        ends[0] = delay_error(f, of, L, scale, -f->side, x), ends[1] = delay_error(f, of, L, scale, f->side, x);
        *worst = fmin(ends[0], ends[1]);
    }
    free(L), free(scale), free(x);
    return best;
}

/* The delay in samples, and its uncertainty. NULL, or why it is not used. */
static const char *delay_judge(const delay_fit *f, double *delay, double *uncertainty)
{
    delay_sums all = delay_room(f);
    double without[DELAY_BLOCKS], mean = 0, square = 0, least, worst, other[2];
    int k;
    for (k = 0; k < DELAY_BLOCKS; k++)
        delay_add(f, &f->block[k], 1, &all);
    *delay = delay_least(f, &all, &least, &worst);
    for (k = 0; k < DELAY_BLOCKS; k++) {
        delay_add(f, &f->block[k], -1, &all);
        without[k] = delay_least(f, &all, &other[0], &other[1]);
        mean += without[k] / DELAY_BLOCKS;
        delay_add(f, &f->block[k], 1, &all);
    }
    for (k = 0; k < DELAY_BLOCKS; k++)
        square += (without[k] - mean) * (without[k] - mean) * (DELAY_BLOCKS - 1) / DELAY_BLOCKS;
    delay_free(&all);
    if (!(fabs(*delay) < HUGE_VAL) || !(square < HUGE_VAL)) return "the torques cannot be explained";
    *uncertainty = 2 * sqrt(square) + 0.05;
    if (fabs(*delay) > f->side - 0.6) return "the error of torques falls up to the end of the range";
    if (least > 0.98 * worst || 4 * *uncertainty > f->side) return "every shift fits these torques nearly as well";
    return fabs(*delay) <= *uncertainty ? "that is no delay" : NULL;
}

/* ---- recordings ---- */

/* The delay of the recordings in s, told; 0: none that can be used. */
static double find_delay(void)
{
    const regression_source source = source_of(&d, 0, d.trajectories);
    const regression_shape small = {0, 0, 0, 0};
    delay_fit f;
    double turn[M(N)], delay = 0, uncertainty = 0;
    const char *why = NULL;
    regression_status st;
    int k;
    if (!JOINTS || (int)M(N) > (int)REGRESSION_JOINTS)
        fail("delay=auto is for models whose coordinates are the joints, without ROLN_INPUTS, of at most %d joints\nhint: "
             "delay=0.005, in s, if it is known; or find it with a model of the same joints without autoencoder",
             (int)REGRESSION_JOINTS);
    memset(&f, 0, sizeof f);
    read_turns(turn);
    f.r = regression_new(M(N), turn), f.held = !d.measured;
    f.side = (int)fmin(fmax(3, floor(DELAY_MOST / d.dt + 0.5)), DELAY_LAGS), f.low = -f.side - 1;
    f.lags = 2 * f.side + DELAY_TAPS;
    f.wide = (int)fmax(1, floor(DELAY_WIDE / d.dt + 0.5)), f.every = (f.wide + 1) / 2;
    st = regression_measure(&f.r, &source);
    if (st == REGRESSION_OK && regression_largest(&f.r, small, DELAY_NUMBERS) < 0 && regression_largest(&f.r, small, 1300) < 0)
        st = REGRESSION_E_FEW;
    if (st != REGRESSION_OK) why = regression_status_text(st);
    else if (delay_sum(&f) * f.r.joints < 2 * f.r.numbers) why = "recordings are too short";
    else why = delay_judge(&f, &delay, &uncertainty);
    for (k = 0; k < DELAY_BLOCKS; k++)
        delay_free(&f.block[k]);
    regression_free(&f.r);
    if (!why) say("delay: %.3g +- %.2g ms: tau acts so long after its stamp\n", 1e3 * d.dt * delay, 1e3 * d.dt * uncertainty);
    else if (uncertainty > 0)
        say("delay: none, of %.3g +- %.2g ms within +- %.3g ms: %s\n", 1e3 * d.dt * delay, 1e3 * d.dt * uncertainty,
               1e3 * d.dt * f.side, why);
    else say("delay: none: %s\n", why);
    return why ? 0 : delay * d.dt;
}

/* tau of m acts `delay` seconds later than its stamp. Recordings lose the samples of which the torque was sent before they began,
   or after they ended. */
static void shift_torques(motion *m, double delay)
{
    const double exact = delay / m->dt, near = floor(exact + 0.5), shift = fabs(exact - near) < 1e-6 ? near : exact;
    const int F = m->forces, held = !m->measured;
    const roln_real *from = held ? m->tau : m->tau_mid;
    roln_real *tau = room((size_t)m->samples + 1, (size_t)F * sizeof *tau);
    double w[DELAY_TAPS];
    const int first = delay_weights(held, 1, shift, w);
    cuts list = {NULL, 0};
    int front = 0, back = 0, k, i, l;
    for (l = 0; l < DELAY_TAPS; l++)
        if (w[l] != 0) front = first + l > front ? first + l : front, back = -first - l > back ? -first - l : back;
    list.p = room((size_t)m->trajectories + 1, sizeof *list.p);
    for (k = 0; k < m->trajectories; k++) {
        const int a = m->first[k] + front, b = m->first[k + 1] - back;
        if (b - a < 3) continue;
        add_cut(&list, k, a, b, 0);
        for (i = a * F; i < b * F; i++) {
            double sum = 0;
            for (l = 0; l < DELAY_TAPS; l++)
                if (w[l] != 0) sum += w[l] * (double)from[i - (first + l) * F];
            tau[i] = (roln_real)sum;
        }
    }
    for (k = 0; k < list.count; k++) /* both forces of a sample, as in recording.h: finish */
        for (i = list.p[k].from * F; i < list.p[k].to * F; i++) {
            const int begin = i < (list.p[k].from + 1) * F, end = i + F >= list.p[k].to * F;
            m->tau_mid[i] = held && !begin ? (tau[i - F] + tau[i]) / 2 : tau[i];
            m->tau[i] = held || end ? tau[i] : (tau[i] + tau[i + F]) / 2;
        }
    if (list.count == 0) fail("%s: no recording is longer than the delay of %g s\nhint: delay= is in s", m->path, delay);
    rebuild(m, &list);
    free(tau), free(list.p);
}

/* delay=: a number in s, or auto. Shifts the torques of motion.csv, and of test= if there is one, by it. */
static void settle_delay(const char *text, motion *other)
{
    char *end;
    const double given = strtod(text, &end);
    const int known = end != text && *end == 0, searched = strcmp(text, "auto") == 0;
    if (!searched && !(known && fabs(given) <= 10))
        fail("delay=%s: a number of seconds, -10 .. 10, or auto\nhint: delay=0.005 is 5 ms", text);
    if (known && given == 0) return;
    if (!(set("torque") > 0)) fail("delay=%s shifts the torques, but torque=0 does not use them\nhint: torque=1", text);
    delay_found = searched ? find_delay() : given;
    if (known) say("delay: %g ms, as delay= says: tau acts so long after its stamp\n", 1e3 * given);
    if (delay_found != 0) shift_torques(&d, delay_found);
    if (delay_found != 0 && other) shift_torques(other, delay_found);
    fflush(stdout);
}

#endif
