/* SPDX-License-Identifier: MIT */
/* layers.c - the deviations of NAME_doubt beside those of a covariance of the last layers (Laplace approximation).

       layers TRAIN.csv TEST.csv [JOINT LOW HIGH]

   Compiled as doubt.c. J is the derivative of the acceleration by the weights of the last layers of all networks, by central
   differences, in units of the rms error of its coordinate. It is taken every 25 ms, or less often, of all recordings of TRAIN.csv
   but the last tenth, which the trainer has held out. A = r I + sum J^T J; u_j = J_j A^-1 J_j^T at another state. The deviation of
   coordinate j has the square s_j^2 (1 + t u_j^(k / 2)). r, t and s_j are those under which the errors in the last tenth are
   likeliest, with k = 2, which is the Laplace approximation, and with the likeliest k of 2 .. 8, which NAME_fit_doubt allows, too.

   Printed are, of the accelerations of windows of 25 ms in TEST.csv, near (novelty below 2) and far: the share of errors within
   1, 2, 3 deviations, and the mean logarithm of the likelihood of an error in units of its rms. With JOINT, counted from 1, the
   geometric mean of the deviations where LOW < q < HIGH over that elsewhere. */
#define main doubt_main
#include "doubt.c"
#undef main

enum {
    RIDGES = 13, FACTORS = 16, /* r from 1000 down, in parts of the mean diagonal of the sum; t from 1e-5 up: powers of ten */
    LAWS = 2, SAYS = LAWS + 1, /* with k = 2, with any; and NAME_doubt */
    WINDOWS = 6000, MOST_LAST = 800
};

static int last[MOST_LAST], P; /* indices of the last weights among the parameters */
static double A[RIDGES][MOST_LAST * MOST_LAST]; /* lower Cholesky factors */
static double J[n * MOST_LAST], rms[n];

/* Windows of 25 ms: where they begin, what the model misses of the acceleration, and u under each ridge. */
typedef struct {
    int count, sample[WINDOWS];
    double e[WINDOWS][n], u[WINDOWS][RIDGES][n];
} windows;
static windows held, test;

static struct {
    int power, ridge;
    double factor, s[n];
} law[LAWS]; /* k, r, t, s */

static void find_last(void)
{
    const rolni_nets all = rolni_nets_of(&M(model).lnn);
    int k, i;
    for (k = 0; k < all.count; k++) {
        const roln_mlp *const f = all.net[k];
        const int end = M(ae_size) + all.at[k] + roln_mlp_params(f), out = f->size[f->layers];
        for (i = end - out * (f->size[f->layers - 1] + 1); i < end - (k == 1); i++) /* no force depends on the bias of V */
            last[P++] = i;
    }
    if (P > MOST_LAST) exit((fprintf(stderr, "%d last weights\n", P), 1));
}

/* L L^T = A [P][P], in place in the lower triangle. Zero unless A is positive definite. */
static int factorise(double *L)
{
    int i, j, k;
    for (i = 0; i < P; i++)
        for (j = 0; j <= i; j++) {
            double x = L[i * P + j];
            for (k = 0; k < j; k++)
                x -= L[i * P + k] * L[j * P + k];
            if (i == j && !(x > 0)) return 0;
            L[i * P + j] = i == j ? sqrt(x) : x / L[j * P + j];
        }
    return 1;
}

/* |L^-1 b|^2 */
static double inverse_square(const double *L, const double *b)
{
    static double x[MOST_LAST];
    double sum = 0;
    int i, k;
    for (i = 0; i < P; i++) {
        x[i] = b[i];
        for (k = 0; k < i; k++)
            x[i] -= L[i * P + k] * x[k];
        x[i] /= L[i * P + i];
        sum += x[i] * x[i];
    }
    return sum;
}

/* zdd [n] at a state under the force tau_z, which does not depend on the last weights. */
static void accelerate(const M(params) *p, const M(latent) *s, const roln_real *tau_z, double *zdd)
{
    static M(dynamics_work) w;
    M(equation) at;
    roln_real b[n], L[n * n];
    int j;
    if (M(dynamics)(p, s, &at, &w) != ROLN_OK || roln_chol(n, at.M, L) != ROLN_OK) exit((fprintf(stderr, "no dynamics\n"), 1));
    for (j = 0; j < n; j++)
        b[j] = tau_z[j] - at.c[j] - at.g[j] - at.d[j];
    roln_solve_lower(n, L, b, b);
    roln_solve_lower_t(n, L, b, b);
    for (j = 0; j < n; j++)
        zdd[j] = (double)b[j];
}

/* J [n][P] at sample i. */
static void differentiate(int i)
{
    static M(params) p;
    static M(reduce_work) w;
    const M(latent) s = state_of(i);
    roln_real tau_z[n] = {0};
    double up[n], down[n];
    int k, j;
    p = M(weights);
    if (acts) (void)M(reduce)(&p, &s, torque(i, 1), tau_z, &w);
    for (k = 0; k < P; k++) {
        const roln_real was = p.theta[last[k]], step = 0.03f;
        p.theta[last[k]] = was + step, accelerate(&p, &s, tau_z, up);
        p.theta[last[k]] = was - step, accelerate(&p, &s, tau_z, down);
        p.theta[last[k]] = was;
        for (j = 0; j < n; j++)
            J[j * P + k] = (up[j] - down[j]) / (2 * (double)step * rms[j]);
    }
}

/* Windows of 25 ms of recordings from .. to - 1, at most WINDOWS / part of them. */
static void find_windows(int from, int to, int part, windows *w)
{
    const int steps = (int)fmax(1, 0.025 / dt + 0.5);
    const int all = (first[to] - first[from]) / steps, each = steps * (1 + all * part / WINDOWS);
    int r, i, j;
    w->count = 0;
    for (r = from; r < to; r++)
        for (i = first[r]; i + steps < first[r + 1]; i += each) {
            roln_real e[2 * n];
            if (w->count == WINDOWS || !missed(i, steps, e)) continue;
            for (j = 0; j < n; j++)
                w->e[w->count][j] = (double)e[j];
            w->sample[w->count++] = i;
        }
}

/* u of each window. */
static void solve_windows(windows *w)
{
    int i, r, j;
    for (i = 0; i < w->count; i++) {
        differentiate(w->sample[i]);
        for (r = 0; r < RIDGES; r++)
            for (j = 0; j < n; j++)
                w->u[i][r][j] = inverse_square(A[r], J + j * P);
    }
}

/* The sums over recordings 0 .. to - 1, and their factors under each ridge. */
static void learn(int to)
{
    static windows w;
    static double sum[MOST_LAST * MOST_LAST];
    double trace = 0;
    int i, j, k, l, r;
    find_windows(0, to, 2, &w);
    for (i = 0; i < w.count; i++)
        for (j = 0; j < n; j++)
            rms[j] += w.e[i][j] * w.e[i][j] / w.count;
    for (j = 0; j < n; j++)
        rms[j] = sqrt(rms[j]);
    for (i = 0; i < w.count; i++) {
        differentiate(w.sample[i]);
        for (j = 0; j < n; j++)
            for (k = 0; k < P; k++)
                for (l = 0; l <= k; l++)
                    sum[k * P + l] += J[j * P + k] * J[j * P + l];
    }
    for (k = 0; k < P; k++)
        trace += sum[k * P + k];
    for (r = 0; r < RIDGES; r++) {
        memcpy(A[r], sum, sizeof sum);
        for (k = 0; k < P; k++)
            A[r][k * P + k] += trace / P * pow(10, 3 - r);
        if (!factorise(A[r])) exit((fprintf(stderr, "ridge %d: not positive definite\n", r), 1));
    }
}

/* (1 + t u^(k / 2)) of coordinate j in window i. */
static double square_of(const windows *w, int i, int ridge, int power, double factor, int j)
{
    return 1 + factor * pow(w->u[i][ridge][j], power / 2.0);
}

/* The law with k = 2 .. most under which held-out errors are likeliest. */
static void fit(int which, int most)
{
    double best = -HUGE_VAL;
    int power, ridge, t, i, j;
    for (power = 2; power <= most; power++)
        for (ridge = 0; ridge < RIDGES; ridge++)
            for (t = 0; t < FACTORS; t++) {
                const double factor = pow(10, t - 5);
                double s[n], score = 0;
                for (j = 0; j < n; j++) {
                    for (s[j] = 0, i = 0; i < held.count; i++)
                        s[j] += held.e[i][j] * held.e[i][j] / square_of(&held, i, ridge, power, factor, j) / held.count;
                    for (i = 0; i < held.count; i++)
                        score -= 0.5 * log(s[j] * square_of(&held, i, ridge, power, factor, j));
                }
                if (score <= best) continue;
                best = score;
                law[which].power = power, law[which].ridge = ridge, law[which].factor = factor;
                for (j = 0; j < n; j++)
                    law[which].s[j] = sqrt(s[j]);
            }
}

static double deviation_of(int which, int i, int j)
{
    return law[which].s[j] * sqrt(square_of(&test, i, law[which].ridge, law[which].power, law[which].factor, j));
}

static void compare(int joint, double low, double high)
{
    static M(doubt_work) w;
    share shares[SAYS][2] = {{{0, {0}}}};
    double score[SAYS][2] = {{0}}, logs[SAYS][2] = {{0}};
    long in[2] = {0, 0};
    int i, j, m;
    for (i = 0; i < test.count; i++) {
        const M(latent) s = state_of(test.sample[i]);
        const double here = joint > 0 ? (double)q[test.sample[i] * N + joint - 1] : 0;
        const int hole = joint > 0 && here > low && here < high;
        M(doubts) d;
        if (M(doubt)(&M(weights), &M(known), &s, &d, &w) != ROLN_OK) continue;
        for (j = 0; j < n; j++, in[hole]++)
            for (m = 0; m < SAYS; m++) {
                const double one = m < LAWS ? deviation_of(m, i, j) : (double)d.zdd[j], e = test.e[i][j] / one;
                const int far = d.novelty >= 2;
                count_in(&shares[m][far], e, 1);
                score[m][far] -= log(one / rms[j]) + 0.5 * e * e;
                logs[m][hole] += log(one);
            }
    }
    for (m = 0; m < SAYS; m++) {
        for (i = 0; i < 2; i++) {
            char what[80];
            if (shares[m][i].count == 0) continue;
            if (m < LAWS) snprintf(what, sizeof what, "last layers, k = %d, %s", law[m].power, i ? "far" : "near");
            else snprintf(what, sizeof what, "NAME_doubt, %s", i ? "far" : "near");
            print(what, &shares[m][i]);
            printf("    likelihood of one error: e^%.2f\n", score[m][i] / (double)shares[m][i].count);
        }
        if (joint > 0)
            printf("    deviation where %g < q%d < %g over that elsewhere: %.1f\n", low, joint, high,
                   exp(logs[m][1] / (double)in[1] - logs[m][0] / (double)in[0]));
    }
}

int main(int argc, char **argv)
{
    const int hole = argc == 6;
    if (argc != 3 && !hole) return fprintf(stderr, "layers TRAIN.csv TEST.csv [JOINT LOW HIGH]\n"), 1;
    find_last();
    read_recordings(argv[1]);
    learn(recordings - recordings / 10);
    find_windows(recordings - recordings / 10, recordings, 4, &held);
    solve_windows(&held);
    fit(0, 2);
    fit(1, 8);
    recordings = 0;
    read_recordings(argv[2]);
    find_windows(0, recordings, 4, &test);
    solve_windows(&test);
    printf("%d weights of last layers; errors of acceleration within\n", P);
    printf("%-28s %8s %9s %9s %9s\n", "", "count", "1", "2", "3 deviations");
    compare(hole ? atoi(argv[3]) : 0, hole ? atof(argv[4]) : 0, hole ? atof(argv[5]) : 0);
    return 0;
}
