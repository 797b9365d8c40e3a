/* SPDX-License-Identifier: MIT */
/* pendulum.c - learn a chain of pendulums from its motion: simulate, train, measure, draw. One core, some seconds.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/pendulum.c -o pendulum -lm
   ./pendulum [directory]      writes chain.svg, the picture, and chain_weights.h, the model for firmware

   Eight rods hang from each other by eight hinges of angles q, tied together so that only two of them are free: the chain
   moves on a curved surface q = phi(z). The simulation knows that surface; the training does not. It sees q, qd, qdd of 30
   recordings and finds two coordinates of its own, with the mass matrix and the potential that move them. The model is
   then asked about 5 recordings that it has never seen.

   1 the chain     2 recordings     3 errors     4 training     5 energy     6 picture     7 main */

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#if defined(__unix__) || defined(__APPLE__)
#include <unistd.h>
#define TERMINAL isatty(1)
#else
#define TERMINAL 0
#endif

#define ROLN_GN_ROWS 2000 /* samples of a step of Gauss-Newton: for the training alone, so not in the config */
#include "chain.h"
#include "chain_plant.h"

enum {
    N = chain_N,             /* joints */
    TRAIN = 30, ALL = 35,    /* recordings: the first for training, the others for the test */
    RATE = 200,              /* samples a second */
    SAMPLES = 3 * RATE + 1,  /* samples of a recording: 3 s */
    STRIDE = 5,              /* samples in a step of the model: 25 ms */
    POINTS = 2 * RATE / STRIDE + 1 /* horizons at which errors are measured: 0, 25 ms, .. 2 s */
};
#define DT (1.0 / RATE)
#define STEP ((roln_real)(STRIDE * DT))

/* ---- 1 the chain ------------------------------------------------------------------------------ */

/* How it moves is in chain_plant.h. */

/* Kinetic energy, and potential energy above that of the chain at rest. */
static void energy(const motion *s, double *T, double *V)
{
    const pose p = pose_of(s);
    *T = *V = 0;
    for (int i = 0; i < N; i++) {
        for (int j = 0; j < N; j++)
            *T += 0.5 * inertia(i, j) * cos(p.a[i] - p.a[j]) * p.ad[i] * p.ad[j];
        *V += weight(i) * (1 - cos(p.a[i]));
    }
}

/* ---- 2 recordings ----------------------------------------------------------------------------- */

/* What the training sees, one recording after the other, and the energies, which it does not see. */
static roln_real q[ALL * SAMPLES][N], qd[ALL * SAMPLES][N], qdd[ALL * SAMPLES][N];
static double T_true[ALL * SAMPLES], V_true[ALL * SAMPLES];

/* Let the chain go somewhere at some speed and record it. Returns max |E - E(0)| / max T of the simulation. */
static double record(int recording, uint64_t *seed)
{
    motion s;
    double E0 = 0, drift = 0, peak = 0;
    for (int i = 0; i < 2; i++) {
        s.z[i] = 1.4 * (double)roln_uniform(seed) - 0.7;
        s.zd[i] = 2 * (double)roln_uniform(seed) - 1;
    }
    for (int row = recording * SAMPLES; row < (recording + 1) * SAMPLES; row++) {
        const pose p = pose_of(&s);
        double zdd[2], a = 0, ad = 0, add = 0;
        acceleration(&s, zdd);
        for (int i = 0; i < N; i++) {
            const double rod_add = p.J[i][0] * zdd[0] + p.J[i][1] * zdd[1] + p.Jdzd[i];
            q[row][i] = (roln_real)(p.a[i] - a);
            qd[row][i] = (roln_real)(p.ad[i] - ad);
            qdd[row][i] = (roln_real)(rod_add - add);
            a = p.a[i], ad = p.ad[i], add = rod_add;
        }
        energy(&s, &T_true[row], &V_true[row]);
        if (row == recording * SAMPLES) E0 = T_true[row] + V_true[row];
        drift = fmax(drift, fabs(T_true[row] + V_true[row] - E0));
        peak = fmax(peak, T_true[row]);
        for (int i = 0; i < 5; i++)
            advance(&s, DT / 5);
    }
    return drift / peak;
}

/* ---- 3 errors --------------------------------------------------------------------------------- */

static chain_params model, linear; /* linear: the start of the training, whose autoencoder is the linear optimum (POD) */
static roln_real qbar[N];          /* mean of the recorded q */
static chain_work work;
static chain_train train_work;

typedef struct { double q[POINTS], qd[POINTS]; } error; /* relative errors E_q, E_qd at horizons 0, 1 .. steps */

static void check(roln_status st, const char *what)
{
    if (st != ROLN_OK) fprintf(stderr, "\n%s: %s\n", what, roln_status_text(st)), exit(1);
}

/* Start a window every 25 ms of recordings first .. last-1. */
static int windows(int first, int last, int steps, int *start)
{
    int count = 0;
    for (int k = first; k < last; k++)
        for (int i = 0; i + steps * STRIDE < SAMPLES; i += RATE / 40)
            start[count++] = k * SAMPLES + i;
    return count;
}

/* E_q = sqrt(sum |q_pred - q|^2 / sum |q - qbar|^2) over windows, E_qd = sqrt(sum |qd_pred - qd|^2 / sum |qd|^2). */
static error ratios(const roln_error *sums, int steps, double missing)
{
    error e;
    for (int k = 0; k <= steps; k++) {
        e.q[k] = missing > 0 ? missing : sqrt((double)(sums[k].q / sums[k].q_var));
        e.qd[k] = missing > 0 ? missing : sqrt((double)(sums[k].qd / sums[k].qd_var));
    }
    return e;
}

/* The learned model: encode the first sample of a window, step, decode. */
static error model_error(int first, int last, int steps)
{
    static int start[ALL * SAMPLES];
    roln_error sums[POINTS];
    const int count = windows(first, last, steps, start);
    const roln_batch b = {.count = count, .steps = steps, .stride = STRIDE, .start = start, .q = q[0], .qd = qd[0]};
    const roln_errors out = {sums, NULL, NULL};
    const roln_status st = chain_errors(&model, &b, STEP, 1, qbar, &out, &train_work.errors);
    return ratios(sums, steps, st == ROLN_OK ? 0 : HUGE_VAL); /* a model that ran away */
}

/* To compare with: the best linear autoencoder, and the motion that goes on as it is, q + h qd. */
static error linear_error(int first, int last, int steps)
{
    static int start[ALL * SAMPLES];
    const int count = windows(first, last, steps, start);
    roln_error sums[POINTS] = {{0}};
    for (int w = 0; w < count; w++) {
        chain_state x;
        chain_latent s;
        memcpy(x.q, q[start[w]], sizeof x.q);
        memcpy(x.qd, qd[start[w]], sizeof x.qd);
        check(chain_encode(&linear, &x, &s, &work.encode), "encode");
        check(chain_decode(&linear, &s, &x, &work.decode), "decode");
        for (int k = 0; k <= steps; k++)
            for (int i = 0; i < N; i++) {
                const int row = start[w] + k * STRIDE;
                const roln_real e = x.q[i] + (roln_real)k * STEP * x.qd[i] - q[row][i], ed = x.qd[i] - qd[row][i];
                sums[k].q += (double)(e * e);
                sums[k].q_var += (double)((q[row][i] - qbar[i]) * (q[row][i] - qbar[i]));
                sums[k].qd += (double)(ed * ed);
                sums[k].qd_var += (double)(qd[row][i] * qd[row][i]);
            }
    }
    return ratios(sums, steps, 0);
}

static void print_table(void)
{
    static const int ms[] = {0, 25, 100, 250, 500, 1000, 2000};
    const error m = model_error(TRAIN, ALL, POINTS - 1), l = linear_error(TRAIN, ALL, POINTS - 1);
    printf("\nerrors on %d recordings not seen in training, in %%\n\n", ALL - TRAIN);
    printf("   horizon     roln, 2 coordinates     POD of rank 2, q + h qd\n"
           "        ms         E_q       E_qd             E_q       E_qd\n");
    for (size_t i = 0; i < sizeof ms / sizeof *ms; i++) {
        const int k = ms[i] * RATE / STRIDE / 1000;
        printf("%10d  %10.3f %10.3f      %10.1f %10.1f\n", ms[i], 100 * m.q[k], 100 * m.qd[k], 100 * l.q[k], 100 * l.qd[k]);
    }
}

/* ---- 4 training ------------------------------------------------------------------------------- */

static double seconds(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

/* The surface: turn the encoder, on every fifth sample, until what the best decoder leaves of q falls by less than 1 % in 20
   steps; then fit the decoder to all samples. */
static void fit_surface(void)
{
    static chain_refinement turn;
    static chain_chart sums;
    static chain_start start_work;
    static int start[TRAIN * SAMPLES / 5];
    const roln_batch b = {.count = TRAIN * SAMPLES / 5, .stride = 1, .start = start, .q = q[0], .qd = qd[0]};
    roln_real left = 1, before = 2;
    roln_status st = ROLN_OK;
    int steps = 0;
    for (int i = 0; i < b.count; i++)
        start[i] = 5 * i;
    for (; st == ROLN_OK && (steps % 20 || left < ROLN_C(0.99) * before); steps++) {
        if (steps % 20 == 0) before = left;
        st = chain_chart_refine(&model, &b, &turn, &left);
    }
    if (st != ROLN_E_NO_CONVERGENCE) check(st, "encoder"); /* it has arrived */
    check(chain_chart_add(&model, TRAIN * SAMPLES, q[0], &sums, &start_work.chart_add), "surface");
    check(chain_chart_solve(&model, &sums, ROLN_CHART_RIDGE, &left, &start_work.chart_solve), "surface");
    printf("surface: %d steps, %.1e of q is left, %.1f s\n", steps, (double)left, seconds());
}

/* The motion on it: M and V by recursive Gauss-Newton, on the accelerations of ROWS random samples a step. A step is judged by
   the first JUDGES of them, and shortened if it promised too much. The model is the mean of the last MEAN ones. */
enum { ROWS = 2000, JUDGES = 500, STEPS = 200, MEAN = 8 };

/* One line, rewritten in place on a terminal: errors on training data. */
static void report(int step)
{
    error e;
    if (step % (TERMINAL ? 10 : 50)) return;
    e = model_error(0, 2, RATE / STRIDE);
    printf("motion: %4d steps, E_q %8.2f %% in 1 s, %2.0f s %s", step, fmin(100 * e.q[RATE / STRIDE], 9999), seconds(),
           TERMINAL && step < STEPS ? "\r" : "\n");
    fflush(stdout);
}

static void fit_motion(uint64_t *seed)
{
    static const roln_loss weights = {.qdd_pred = 1};
    static const roln_newton_opt opt = ROLN_NEWTON_OPT;
    static chain_residuals rows;
    static chain_newton newton = {.state = ROLN_NEWTON_START};
    static roln_real sum_work[ROLN_SYM_WORK], mean[chain_theta_size];
    int start[ROWS];
    roln_batch b = {.count = ROWS, .stride = 1, .start = start, .q = q[0], .qd = qd[0], .qdd = qdd[0]};
    for (int t = 1; t <= STEPS; t++) {
        for (int i = 0; i < ROWS; i++)
            start[i] = roln_randint(TRAIN * SAMPLES, seed);
        rows.seed = roln_rand(seed), b.count = ROWS;
        check(chain_rows(&model, &weights, &b, STEP, 0, 0, &rows, &train_work.rows), "rows");
        check(chain_newton_rows(&model, &opt, ROWS, &rows, &newton), "rows");
        chain_newton_normal_equations(&opt, ROWS, 0, chain_newton_side, &rows, &newton, sum_work);
        b.count = JUDGES;
        for (int taken = 0, tries = 0; !taken && tries < 10; tries++) {
            check(chain_newton_step(&model, &opt, ROWS, &rows, &newton), "step");
            chain_rows(&newton.next, &weights, &b, STEP, 0, 1, &rows, &train_work.rows); /* what fails there is refused */
            taken = chain_newton_accept(&model, ROWS, JUDGES, &rows, &newton);
        }
        for (int i = 0; i < chain_theta_size && t > STEPS - MEAN; i++)
            mean[i] += model.theta[i] / MEAN;
        report(t);
    }
    memcpy(model.theta, mean, sizeof mean);
}

/* ---- 5 energy --------------------------------------------------------------------------------- */

/* No recorded force does work, so the data know M and V only up to one common factor, and V up to a constant: both are
   fitted here to the true energies of the training recordings. */
static double joule, V_rest;

static void learned_energy(const chain_latent *s, double *T, double *V)
{
    chain_equation e = {0}; /* check ends the program, which a compiler does not see */
    check(chain_dynamics(&model, s, &e, &work.dynamics), "energy");
    *T = joule * (double)e.T;
    *V = joule * (double)e.V + V_rest;
}

static chain_latent encoded(int row)
{
    chain_state x;
    chain_latent s;
    memcpy(x.q, q[row], sizeof x.q);
    memcpy(x.qd, qd[row], sizeof x.qd);
    check(chain_encode(&model, &x, &s, &work.encode), "encode");
    return s;
}

static void fit_energy(void)
{
    double TT = 0, Tt = 0, offset = 0, T, V;
    joule = 1, V_rest = 0;
    for (int row = 0; row < TRAIN * SAMPLES; row++) {
        const chain_latent s = encoded(row);
        learned_energy(&s, &T, &V);
        Tt += T * T_true[row];
        TT += T * T;
    }
    joule = Tt / TT;
    for (int row = 0; row < TRAIN * SAMPLES; row++) {
        const chain_latent s = encoded(row);
        learned_energy(&s, &T, &V);
        offset += V_true[row] - V;
    }
    V_rest = offset / (TRAIN * SAMPLES);
}

/* A prediction of a whole recording from its first sample. */
typedef struct { double q[N][SAMPLES], T[SAMPLES], V[SAMPLES], E[SAMPLES]; } course;

static course predict(int recording)
{
    course c;
    chain_state x;
    chain_latent s = encoded(recording * SAMPLES);
    for (int k = 0; k < SAMPLES; k++) {
        check(chain_decode(&model, &s, &x, &work.decode), "decode");
        for (int i = 0; i < N; i++)
            c.q[i][k] = (double)x.q[i];
        learned_energy(&s, &c.T[k], &c.V[k]);
        c.E[k] = c.T[k] + c.V[k];
        check(chain_step(&model, &s, NULL, (roln_real)DT, &work.step), "step");
    }
    return c;
}

static course truth(int recording)
{
    course c;
    for (int k = 0; k < SAMPLES; k++) {
        const int row = recording * SAMPLES + k;
        for (int i = 0; i < N; i++)
            c.q[i][k] = (double)q[row][i];
        c.T[k] = T_true[row];
        c.V[k] = V_true[row];
        c.E[k] = c.T[k] + c.V[k];
    }
    return c;
}

static void print_energy(void)
{
    double eT = 0, eV = 0, ET = 0, EV = 0, worst = 0;
    for (int k = TRAIN; k < ALL; k++) {
        const course c = predict(k);
        double drift = 0, peak = 0;
        for (int i = 0; i < SAMPLES; i++) {
            const int row = k * SAMPLES + i;
            const chain_latent s = encoded(row);
            double T, V;
            learned_energy(&s, &T, &V);
            eT += (T - T_true[row]) * (T - T_true[row]);
            eV += (V - V_true[row]) * (V - V_true[row]);
            ET += T_true[row] * T_true[row];
            EV += V_true[row] * V_true[row];
            drift = fmax(drift, fabs(c.E[i] - c.E[0]));
            peak = fmax(peak, c.T[i]);
        }
        worst = fmax(worst, drift / peak);
    }
    printf("\nenergy, after fitting one factor (%.4g J) and one constant: kinetic %.2f %%, potential %.2f %% off\n"
           "drift of the energy in a prediction of 3 s: %.1e of the largest kinetic energy\n",
           joule, 100 * sqrt(eT / ET), 100 * sqrt(eV / EV), worst);
}

/* ---- 6 picture -------------------------------------------------------------------------------- */

/* True: broad and pale. Predicted: thin, dark, dashed. */
static const char *const pale[] = {"#9ecae1", "#fdbe85", "#a1d99b", "#d4b9da"};
static const char *const dark[] = {"#08519c", "#a63603", "#006d2c", "#7a0177"};

typedef struct { double left, top, width, height, low, high, tick; } axes; /* a plot over time, 0 .. 3 s */

static void draw_axes(FILE *f, const axes *a, const char *title)
{
    fprintf(f, "<text x='%g' y='%g' font-weight='bold'>%s</text>\n", a->left, a->top - 12, title);
    for (double v = ceil(a->low / a->tick) * a->tick; v <= a->high + 1e-9; v += a->tick) {
        const double y = a->top + a->height * (a->high - v) / (a->high - a->low);
        fprintf(f, "<path d='M%g %.1fh%g' stroke='#e4e4e4'/><text x='%g' y='%.1f' text-anchor='end'>%.2g</text>\n", a->left, y,
                a->width, a->left - 6, y + 4, fabs(v) < 1e-9 ? 0 : v);
    }
    for (int s = 0; s <= 3; s++)
        fprintf(f, "<text x='%g' y='%g' text-anchor='middle'>%d%s</text>\n", a->left + a->width * s / 3, a->top + a->height + 18,
                s, s == 3 ? " s" : "");
    fprintf(f, "<path d='M%g %gv%gh%g' fill='none' stroke='#444'/>\n", a->left, a->top, a->height, a->width);
}

static void draw_curve(FILE *f, const axes *a, const double y[SAMPLES], int predicted, int colour)
{
    fprintf(f, "<path fill='none' stroke='%s' %s d='", predicted ? dark[colour] : pale[colour],
            predicted ? "stroke-width='1.4' stroke-dasharray='6 4'" : "stroke-width='4'");
    for (int k = 0; k < SAMPLES; k += 2)
        fprintf(f, "%c%.1f %.1f", k ? 'L' : 'M', a->left + a->width * k / (SAMPLES - 1),
                a->top + a->height * (a->high - y[k]) / (a->high - a->low));
    fprintf(f, "'/>\n");
}

static void draw_key(FILE *f, double x, double y, int colour, const char *text)
{
    fprintf(f, "<path d='M%g %gh22' stroke='%s' stroke-width='4'/>", x, y - 4, pale[colour]);
    fprintf(f, "<path d='M%g %gh22' stroke='%s' stroke-width='1.4' stroke-dasharray='6 4'/>", x, y - 4, dark[colour]);
    fprintf(f, "<text x='%g' y='%g'>%s</text>\n", x + 28, y, text);
}

static void draw_chain(FILE *f, double x, double y, const course *c, int k, int predicted)
{
    const double scale = 165 / (N * ROD); /* pixels per metre */
    double a = 0;
    fprintf(f, "<path fill='none' stroke-linejoin='round' stroke='%s' %s d='M%g %g", predicted ? dark[0] : pale[0],
            predicted ? "stroke-width='1.6' stroke-dasharray='6 4'" : "stroke-width='6' stroke-linecap='round'", x, y);
    for (int i = 0; i < N; i++) {
        a += c->q[i][k];
        x += scale * ROD * sin(a);
        y += scale * ROD * cos(a);
        fprintf(f, "L%.1f %.1f", x, y);
    }
    fprintf(f, "'/>\n");
}

static void draw(const char *path, int recording)
{
    static const int joint[4] = {0, 3, 4, 7};
    static course c[2]; /* true, predicted */
    axes angle = {56, 84, 500, 170, 0, 0, 0.5}, joules = {640, 84, 236, 170, 0, 0, 0.05};
    FILE *f = fopen(path, "w");
    if (!f) fprintf(stderr, "cannot write %s\n", path), exit(1);
    c[0] = truth(recording), c[1] = predict(recording);
    for (int k = 0; k < SAMPLES; k++) {
        for (int j = 0; j < 4; j++) {
            angle.low = fmin(angle.low, c[0].q[joint[j]][k] - 0.02);
            angle.high = fmax(angle.high, c[0].q[joint[j]][k] + 0.02);
        }
        joules.high = fmax(joules.high, 1.05 * c[0].E[k]);
    }
    joules.tick = joules.high > 0.5 ? 0.2 : 0.1;
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='520' viewBox='0 0 900 520' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='900' height='520' fill='#fff'/>\n"
               "<text x='24' y='32' font-size='16'>8 joints, 2 learned coordinates: 3 s of unseen motion predicted from one "
               "sample</text>\n");
    draw_key(f, 742, 32, 0, "true, predicted");
    draw_axes(f, &angle, "joint angles, rad");
    draw_axes(f, &joules, "energy, J");
    for (int p = 0; p < 2; p++) {
        for (int j = 0; j < 4; j++)
            draw_curve(f, &angle, c[p].q[joint[j]], p, j);
        draw_curve(f, &joules, c[p].E, p, 3);
        draw_curve(f, &joules, c[p].V, p, 2);
        draw_curve(f, &joules, c[p].T, p, 1);
    }
    for (int j = 0; j < 4; j++) {
        char name[16];
        snprintf(name, sizeof name, "q%d", joint[j] + 1);
        draw_key(f, 300 + 64 * j, 72, j, name);
    }
    draw_key(f, 724, 72, 1, "T");
    draw_key(f, 776, 72, 2, "V");
    draw_key(f, 828, 72, 3, "T+V");
    for (int j = 0; j < 5; j++) {
        const double x = 100 + 175 * j;
        fprintf(f, "<path d='M%g 316h40' stroke='#444' stroke-width='2'/><text x='%g' y='308' text-anchor='middle'>%.3g s</text>\n",
                x - 20, x, 0.75 * j);
        for (int p = 0; p < 2; p++)
            draw_chain(f, x, 317, &c[p], (SAMPLES - 1) * j / 4, p);
    }
    fprintf(f, "</svg>\n");
    fclose(f);
}

/* ---- 7 main ----------------------------------------------------------------------------------- */

static void put_file(void *ctx, const char *text)
{
    fputs(text, (FILE *)ctx);
}

int main(int argc, char **argv)
{
    static chain_start start_work;
    const char *directory = argc > 1 ? argv[1] : ".";
    char svg[512], weights[512];
    uint64_t seed = 1;
    double drift = 0;
    FILE *f;
    snprintf(svg, sizeof svg, "%s/chain.svg", directory);
    snprintf(weights, sizeof weights, "%s/chain_weights.h", directory);
    f = fopen(weights, "w"); /* now, not after the training */
    if (!f) fprintf(stderr, "cannot write %s\n", weights), exit(1);

    for (int k = 0; k < ALL; k++)
        drift = fmax(drift, record(k, &seed));
    printf("chain of %d joints, %d of them free: %d recordings of %d s simulated, energy kept to %.0e\n", N, chain_n, ALL,
           (SAMPLES - 1) / RATE, drift);

    check(chain_init_pod(&model, TRAIN * SAMPLES, q[0], qd[0], qbar, &seed, &start_work.init_pod), "start");
    linear = model;
    fit_surface();
    fit_motion(&seed);
    model.dt = STEP;
    check(chain_fit_range(&model, TRAIN * SAMPLES, q[0], qd[0], &train_work.fit_range), "range");

    print_table();
    fit_energy();
    print_energy();
    draw(svg, TRAIN);
    fprintf(f, "/* chain_weights.h - written by examples/pendulum.c; include chain.h first. 1 J = %.6g of the model. */\n",
            1 / joule);
    chain_write(&model, put_file, f);
    fclose(f);
    printf("\nwrote %s and %s after %.0f s\n", svg, weights, seconds());
    return 0;
}
