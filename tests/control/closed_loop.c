/* SPDX-License-Identifier: MIT */
/* closed_loop - every law along every reference for 60 s, gains of 5, 10, 20 rad/s, and a picture.
     closed_loop OUT.svg [MODEL.roln]        from the top of the repository */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "control.h"

enum { N = 16, STEPS = 60000, SHOWN = 10000, EVERY = 25 };  /* samples of 1 ms: of a run, in the picture, from point to point */
#define W 10.0

/* ---- picture ---- */

static const char *const colour[] = {"#e6550d", "#31a354", "#08519c"};
static double (*trace[3])[N];   /* PD, PD + true gravity, latent */
static double wanted[SHOWN + 1][N];

typedef struct { double left, top, width, height, low, high; } axes;

static double at(const axes *a, double y)
{
    return a->top + a->height * (a->high - fmax(a->low, fmin(a->high, y))) / (a->high - a->low);
}

static void draw_axes(FILE *f, const axes *a, const char *title, double tick, int log)
{
    fprintf(f, "<text x='%g' y='%g' font-weight='bold'>%s</text>\n", a->left, a->top - 12, title);
    for (double v = ceil(a->low / tick) * tick; v <= a->high + 1e-9; v += tick)
        fprintf(f, "<path d='M%g %.1fh%g' stroke='#e4e4e4'/><text x='%g' y='%.1f' text-anchor='end'>%.4g</text>\n",
                a->left, at(a, v), a->width, a->left - 6, at(a, v) + 4, log ? pow(10, v) : fabs(v) < 1e-9 ? 0 : v);
    for (int s = 0; s <= 10; s += 2)
        fprintf(f, "<text x='%g' y='%g' text-anchor='middle'>%d%s</text>\n", a->left + a->width * s / 10,
                a->top + a->height + 18, s, s == 10 ? " s" : "");
    fprintf(f, "<path d='M%g %gv%gh%g' fill='none' stroke='#444'/>\n", a->left, a->top, a->height, a->width);
}

static void draw_curve(FILE *f, const axes *a, const double *y, const char *style)
{
    fprintf(f, "<path fill='none' %s d='", style);
    for (int k = 0; k <= SHOWN / EVERY; k++)
        fprintf(f, "%c%.1f %.1f", k ? 'L' : 'M', a->left + a->width * k * EVERY / SHOWN, at(a, y[k]));
    fprintf(f, "'/>\n");
}

static void draw_joint(FILE *f, const axes *a, int joint)
{
    double y[SHOWN / EVERY + 1];
    char text[80];
    snprintf(text, sizeof text, "joint %d, rad", joint);
    draw_axes(f, a, text, .2, 0);
    for (int c = -1; c < 3; c++) {
        for (int k = 0; k <= SHOWN / EVERY; k++) y[k] = c < 0 ? wanted[EVERY * k][joint] : trace[c][EVERY * k][joint];
        snprintf(text, sizeof text, "stroke='%s' stroke-width='%s'", c < 0 ? "#ccc" : colour[c], c < 0 ? "5" : "1.4");
        draw_curve(f, a, y, text);
    }
}

/* Over 16 joints, rms of each point's 25 ms, log10 of mrad. */
static void draw_error(FILE *f, const axes *a)
{
    double y[SHOWN / EVERY + 1];
    char style[80];
    draw_axes(f, a, "error, mrad, rms of 16 joints", 1, 1);
    for (int c = 0; c < 3; c++) {
        for (int k = 0; k <= SHOWN / EVERY; k++) {
            double sum = 1e-12;
            int count = 0;
            for (int j = EVERY * k; j < EVERY * (k + 1) && j <= SHOWN; j++)
                for (int i = 0; i < N; i++, count++) sum += pow(1e3 * (trace[c][j][i] - wanted[j][i]), 2);
            y[k] = log10(sqrt(sum / count));
        }
        snprintf(style, sizeof style, "stroke='%s' stroke-width='1.4'", colour[c]);
        draw_curve(f, a, y, style);
    }
}

static int draw(const char *path, int joint0, int joint1)
{
    static const char *const key[] = {"PD", "PD + true gravity", "latent control"};
    axes first = {56, 84, 500, 170, 0, 0}, second = {56, 320, 500, 170, 0, 0}, error = {640, 84, 236, 406, -2, 3};
    FILE *f = fopen(path, "w");
    if (!f) {
        perror(path);
        return -1;
    }
    for (int k = 0; k <= SHOWN; k++)
        for (int c = 0; c < 3; c++) {
            first.low = fmin(first.low, trace[c][k][joint0] - .02);
            first.high = fmax(first.high, trace[c][k][joint0] + .02);
            second.low = fmin(second.low, trace[c][k][joint1] - .02);
            second.high = fmax(second.high, trace[c][k][joint1] + .02);
        }
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='526' viewBox='0 0 900 526' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='900' height='526' fill='#fff'/>\n"
               "<text x='24' y='32' font-size='16'>16 joints, 4 learned coordinates: tracking at equal gains</text>\n");
    for (int c = -1; c < 3; c++) {
        static const int at_x[] = {488, 586, 642, 784};
        const int x = at_x[c + 1];
        fprintf(f, "<path d='M%d 28h20' stroke='%s' stroke-width='%s'/><text x='%d' y='32'>%s</text>\n", x,
                c < 0 ? "#ccc" : colour[c], c < 0 ? "5" : "1.8", x + 26, c < 0 ? "reference" : key[c]);
    }
    draw_joint(f, &first, joint0);
    draw_joint(f, &second, joint1);
    draw_error(f, &error);
    fprintf(f, "</svg>\n");
    const int bad = ferror(f);
    if (fclose(f) || bad) {
        perror(path);
        return -1;
    }
    printf("wrote %s\n", path);
    return 0;
}

/* ---- runs ---- */

static int run(struct control_model *m, double w, int number, enum control_law law, struct control_result *r, double *path)
{
    const struct control_reference ref = control_reference((uint64_t)number);
    struct control_gains g;
    if (control_gains(m, w, 1, &g) || control_run(m, &ref, law, &g, STEPS, r, path)) return -1;
    if (r->bad) printf("%d of %d ticks refused\n", r->bad, STEPS);
    fflush(stdout);
    return 0;
}

int main(int argc, char **argv)
{
    static const double others[] = {5, 20};
    struct control_model *m = control_load(argc > 2 ? argv[2] : CONTROL_MODEL);
    struct control_result r[CONTROL_LAWS];
    struct control_gains g;
    if (argc < 2 || !m) return 2;
    for (int c = 0; c < 3; c++)
        if (!(trace[c] = malloc(STEPS * sizeof *trace[c]))) return 1;

    if (control_gains(m, W, 1, &g)) return 1;
    printf("60 s at 1 kHz; Kp = w^2 M, Kd = 2 w M, w = %g rad/s: Kp", W);
    for (int i = 0; i < 4; i++) printf(" %.3g", (double)g.kp[i]);
    printf(", Kd");
    for (int i = 0; i < 4; i++) printf(" %.3g", (double)g.kd[i]);
    printf("\n");
    control_heading();
    for (int number = 1; number <= CONTROL_REFERENCES; number++) {
        printf("reference %d\n", number);
        for (int law = 0; law < CONTROL_LAWS; law++) {
            if (run(m, W, number, (enum control_law)law, &r[law], number == 1 && law < 3 ? trace[law][0] : NULL)) return 1;
            control_row((enum control_law)law, &r[law], &r[law == CONTROL_LATENT_4 ? CONTROL_PD_4 : 0]);
        }
    }
    for (int i = 0; i < 2; i++) {
        printf("w = %g rad/s\n", others[i]);
        for (int number = 1; number <= CONTROL_REFERENCES; number++)
            for (int law = 0; law <= CONTROL_LATENT; law++) {
                if (run(m, others[i], number, (enum control_law)law, &r[law], NULL)) return 1;
                control_row((enum control_law)law, &r[law], &r[0]);
            }
    }

    const struct control_reference ref = control_reference(1);
    for (int k = 0; k <= SHOWN; k++) {
        double qd[N], qdd[N];
        control_reference_at(&ref, k * 1e-3, wanted[k], qd, qdd);
    }
    if (draw(argv[1], 0, 6)) return 1;
    for (int c = 0; c < 3; c++) free(trace[c]);
    control_free(m);
    return 0;
}
