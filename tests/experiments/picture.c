/* picture.c - the pictures of RESULTS.md. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "report.h"

enum { WIDTH = 760, POINTS = 12, SERIES = 12 };

static FILE *open_svg(const char *path, const char *title, int height)
{
    FILE *f = fopen(path, "w");
    if (!f) return perror(path), NULL;
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='%d' height='%d' viewBox='0 0 %d %d' font-family='Helvetica, Arial, "
               "sans-serif' font-size='12' fill='#222'>\n<rect width='%d' height='%d' fill='#fff'/>\n"
               "<text x='20' y='30' font-size='16'>%s</text>\n", WIDTH, height, WIDTH, height, WIDTH, height, title);
    return f;
}

static int close_svg(FILE *f, const char *path)
{
    fprintf(f, "</svg>\n");
    const int bad = ferror(f);
    return fclose(f) != 0 || bad ? perror(path), -1 : 1;
}

/* ---- curves ---- */

static const char *const horizons[] = {"1", "5", "25", "100", "250", "400", "500", "1000", "2000"};
static const char *const few[] = {"5", "10", "20", "40"};

struct curve {
    int count;
    double x[POINTS], y[POINTS], least[POINTS], most[POINTS];
    double end_x, end_y, label_y; /* px: its last point, its label */
};

/* Frame in px, and the values at its edges. */
struct frame {
    double left, top, width, height, x0, x1, y0, y1;
};

static double place_x(const struct frame *a, double x) { return a->left + a->width * log(x / a->x0) / log(a->x1 / a->x0); }
static double place_y(const struct frame *a, double y)
{
    return a->top + a->height * (1 - log(fmax(y, 1e-9) / a->y0) / log(a->y1 / a->y0));
}

static int gather(const struct panel *p, const struct series *s, struct curve *c)
{
    const int n = p->argument ? (int)(sizeof few / sizeof *few) : (int)(sizeof horizons / sizeof *horizons);
    char recipe[64];
    c->count = 0;
    for (int i = 0; i < n; i++) {
        const char *x = p->argument ? few[i] : horizons[i];
        recipe_few(recipe, sizeof recipe, s->recipe, x);
        const struct stat v = stat_of(recipe, p->key, p->argument ? p->argument : x);
        if (v.count == 0) continue;
        c->x[c->count] = atof(x), c->y[c->count] = v.median, c->least[c->count] = v.least, c->most[c->count] = v.most;
        c->count++;
    }
    return c->count;
}

/* 1, 2, 5 of every decade, or its 1 alone where there are many. */
static void draw_axes(FILE *f, const struct frame *a, const struct panel *p)
{
    static const int step[] = {1, 2, 5};
    static const struct { double x; const char *text; } ms[] = {{1, "1 ms"}, {10, "10 ms"}, {100, "100 ms"}, {1000, "1 s"}};
    const double bottom = a->top + a->height;
    const int fine = a->y1 / a->y0 < 60;
    fprintf(f, "<text x='%.1f' y='%.1f' font-weight='bold'>%s</text>\n", a->left, a->top - 14, p->title);
    for (int k = -9; k < 9; k++)
        for (int j = 0; j < (fine ? 3 : 1); j++) {
            const double v = step[j] * pow(10, k);
            if (v < .999 * a->y0 || v > 1.001 * a->y1) continue;
            fprintf(f, "<path d='M%.1f %.1fh%.1f' stroke='#e4e4e4'/><text x='%.1f' y='%.1f' text-anchor='end'>%g</text>\n", a->left,
                    place_y(a, v), a->width, a->left - 6, place_y(a, v) + 4, v);
        }
    for (int i = 0; i < 4; i++) {
        const double x = place_x(a, p->argument ? atof(few[i]) : ms[i].x);
        fprintf(f, "<path d='M%.1f %.1fv4' stroke='#444'/><text x='%.1f' y='%.1f' text-anchor='middle'>%s</text>\n", x, bottom, x,
                bottom + 18, p->argument ? few[i] : ms[i].text);
    }
    fprintf(f, "<text x='%.1f' y='%.1f' text-anchor='middle'>%s</text>\n", a->left + a->width / 2, bottom + 36,
            p->argument ? "training trajectories" : "horizon");
    fprintf(f, "<path d='M%.1f %.1fv%.1fh%.1f' fill='none' stroke='#444'/>\n", a->left, a->top, a->height, a->width);
}

/* Curves leave the frame at its top. */
static void draw_curve(FILE *f, const struct frame *a, const struct series *s, struct curve *c, int clip, double aside, int bars)
{
    fprintf(f, "<g clip-path='url(#c%d)' stroke='%s' fill='none'>\n<path stroke-width='2' stroke-linejoin='round' "
               "stroke-dasharray='%s' d='", clip, s->colour, *s->dash ? s->dash : "none");
    for (int i = 0; i < c->count; i++)
        fprintf(f, "%c%.1f %.1f", i ? 'L' : 'M', place_x(a, c->x[i]) + aside, place_y(a, fmin(c->y[i], 1e9)));
    fprintf(f, "'/>\n");
    for (int i = 0; i < c->count && bars; i++)
        if (c->most[i] > c->least[i])
            fprintf(f, "<path d='M%.1f %.1fV%.1f' stroke-width='1'/>\n", place_x(a, c->x[i]) + aside,
                    place_y(a, fmin(c->least[i], 1e9)), place_y(a, fmin(c->most[i], 1e9)));
    for (int i = 0; i < c->count; i++)
        fprintf(f, "<circle cx='%.1f' cy='%.1f' r='2' fill='%s'/>\n", place_x(a, c->x[i]) + aside, place_y(a, fmin(c->y[i], 1e9)),
                s->colour);
    fprintf(f, "</g>\n");
    int last = c->count - 1;
    while (last > 0 && c->y[last] > a->y1)
        last--;
    c->end_x = place_x(a, c->x[last]) + aside, c->end_y = fmax(place_y(a, c->y[last]), a->top);
    if (last == c->count - 1) return;
    /* where it leaves */
    const double y = place_y(a, fmin(c->y[last + 1], 1e9)), x = place_x(a, c->x[last + 1]) + aside;
    if (c->end_y > a->top) c->end_x += (x - c->end_x) * (c->end_y - a->top) / (c->end_y - y);
    c->end_y = a->top;
}

/* Labels on the right, no two closer than a line; of curves that leave at the top the first is highest. */
static void draw_labels(FILE *f, const struct frame *a, const struct series *s, struct curve *c, int count)
{
    enum { LINE = 14 };
    const double right = a->left + a->width, bottom = a->top + a->height;
    int order[SERIES], n = 0;
    for (int i = 0; i < count; i++) {
        if (c[i].count == 0) continue;
        int k = n++;
        c[i].label_y = c[i].end_y;
        for (; k > 0; k--) {
            const struct curve *above = &c[order[k - 1]];
            if (above->end_y < c[i].end_y || (above->end_y <= c[i].end_y && above->end_x <= c[i].end_x)) break;
            order[k] = order[k - 1];
        }
        order[k] = i;
    }
    for (int k = 1; k < n; k++)
        c[order[k]].label_y = fmax(c[order[k]].label_y, c[order[k - 1]].label_y + LINE);
    for (int k = n - 1; k >= 0; k--)
        c[order[k]].label_y = fmin(c[order[k]].label_y, k == n - 1 ? bottom : c[order[k + 1]].label_y - LINE);
    for (int k = 0; k < n; k++) {
        const struct curve *o = &c[order[k]];
        fprintf(f, "<path d='M%.1f %.1fL%.1f %.1fL%.1f %.1f' fill='none' stroke='%s' stroke-width='.7'/>", o->end_x + 3,
                o->end_y, right + 6, o->end_y, right + 18, o->label_y, s[order[k]].colour);
        fprintf(f, "<text x='%.1f' y='%.1f' fill='%s'>%s</text>\n", right + 21, o->label_y + 4, s[order[k]].colour,
                s[order[k]].label);
    }
}

static void draw_panel(FILE *f, struct frame *a, const struct panel *p, int number)
{
    struct curve c[SERIES];
    double low = HUGE_VAL, high = 0;
    for (int i = 0; i < p->count; i++)
        for (int k = gather(p, &p->series[i], &c[i]) - 1; k >= 0; k--)
            low = fmin(low, p->argument ? c[i].least[k] : c[i].y[k]), high = fmax(high, p->argument ? c[i].most[k] : c[i].y[k]);
    if (high == 0) return;
    high = fmin(high, fmax(200, 5 * low)), low = fmin(low, high / 3); /* % */
    a->x0 = p->argument ? 4.5 : 1, a->x1 = p->argument ? 44 : 2000;
    a->y0 = fmax(low, 1e-6) / 1.2, a->y1 = high * 1.2;
    draw_axes(f, a, p);
    fprintf(f, "<clipPath id='c%d'><rect x='%.1f' y='%.1f' width='%.1f' height='%.1f'/></clipPath>\n", number, a->left - 3, a->top,
            a->width + 6, a->height);
    for (int i = 0; i < p->count; i++)
        if (c[i].count > 0) draw_curve(f, a, &p->series[i], &c[i], number, p->argument ? 4 * (i - .5 * (p->count - 1)) : 0,
                                       p->argument != NULL);
    draw_labels(f, a, p->series, c, p->count);
}

int picture_curves(const char *path, const char *title, const struct panel *panel, int panels, int height)
{
    enum { AXIS = 52, LABELS = 118, EDGE = 4 };
    struct curve c;
    int any = 0;
    for (int p = 0; p < panels; p++)
        for (int i = 0; i < panel[p].count; i++)
            any |= gather(&panel[p], &panel[p].series[i], &c) > 0;
    if (!any) return 0;
    FILE *f = open_svg(path, title, height);
    if (!f) return -1;
    for (int p = 0; p < panels; p++) {
        const double wide = (double)(WIDTH - 2 * EDGE) / panels;
        struct frame a = {EDGE + AXIS + p * wide, 76, wide - AXIS - LABELS, height - 76 - 50, 0, 0, 0, 0};
        draw_panel(f, &a, &panel[p], p);
    }
    return close_svg(f, path);
}

/* ---- shapes ---- */

enum { INSTANTS = 5, BEADS = 200 };

struct shapes {
    int count, beads, ms[INSTANTS];
    double x[2][INSTANTS][3 * BEADS]; /* true, predicted; mm */
};

#define TRUE_LINE "fill='none' stroke='#9ecae1' stroke-width='6' stroke-linecap='round' stroke-linejoin='round'"
#define PREDICTED_LINE "fill='none' stroke='#08519c' stroke-width='1.6' stroke-dasharray='6 4' stroke-linejoin='round'"

static struct shapes *shapes_read(const char *run)
{
    char path[512], whose[16];
    snprintf(path, sizeof path, "%s/%s.path", result_dir, run);
    struct shapes *s = calloc(1, sizeof *s);
    FILE *f = s ? fopen(path, "r") : NULL;
    int ms, seen[2] = {0, 0};
    while (f && fscanf(f, " path %15s %d", whose, &ms) == 2) {
        const int p = strcmp(whose, "predicted") == 0;
        int n = 0;
        double *x = seen[p] < INSTANTS ? s->x[p][seen[p]] : NULL;
        while (x && n < 3 * BEADS && fscanf(f, "%lf", &x[n]) == 1)
            n++;
        if (!x || (s->beads && n != 3 * s->beads)) break;
        s->ms[seen[p]++] = ms, s->beads = n / 3;
    }
    if (f) fclose(f);
    if (s) s->count = seen[0] < seen[1] ? seen[0] : seen[1];
    if (s && s->count > 0 && s->beads > 1) return s;
    free(s);
    return NULL;
}

/* Side view in the plane in which the rope starts, from where it starts on the left; each instant hangs a step to the right. */
int picture_rope(const char *path, const char *title, const char *run)
{
    enum { TOP = 66, HIGH = 380, EDGE = 40, HEIGHT = TOP + HIGH + 50, APART = 54 };
    struct shapes *s = shapes_read(run);
    if (!s) return 0;
    const double *end = s->x[0][0] + 3 * (s->beads - 1), length = -fmax(1, hypot(end[0], end[1]));
    const double u = end[0] / length, v = end[1] / length;
    double left = 0, right = 0, low = 0, high = 0, label[INSTANTS];
    for (int k = 0; k < s->count; k++)
        for (int b = 0; b < s->beads; b++) {
            const double *x = s->x[0][k] + 3 * b, along = u * x[0] + v * x[1];
            left = fmin(left, along), right = fmax(right, along), low = fmin(low, x[2]), high = fmax(high, x[2]);
        }
    const double scale = fmin((WIDTH - 2 * EDGE) / (right - left + 1), HIGH / (high - low + 1));
    const double step = fmin(130, (WIDTH - 2 * EDGE - scale * (right - left)) / INSTANTS);
    const double x0 = .5 * (WIDTH - scale * (left + right) - step * (s->count - 1)), y0 = TOP + scale * high;
    FILE *f = open_svg(path, title, HEIGHT);
    if (!f) return free(s), -1;
    fprintf(f, "<path d='M592 26h22' " TRUE_LINE "/><text x='622' y='30'>true</text>\n"
               "<path d='M660 26h22' " PREDICTED_LINE "/><text x='688' y='30'>predicted</text>\n");
    for (int k = 0; k < s->count; k++) {
        for (int p = 0; p < 2; p++) {
            fprintf(f, "<path %s d='", p ? PREDICTED_LINE : TRUE_LINE);
            for (int b = 0; b < s->beads; b++) {
                const double *x = s->x[p][k] + 3 * b;
                fprintf(f, "%c%.1f %.1f", b ? 'L' : 'M', x0 + k * step + scale * (u * x[0] + v * x[1]), y0 - scale * x[2]);
            }
            fprintf(f, "'/>\n");
        }
        fprintf(f, "<circle cx='%.1f' cy='%.1f' r='4'/>\n", x0 + k * step, y0);
        end = s->x[0][k] + 3 * (s->beads - 1);
        label[k] = x0 + k * step + scale * (u * end[0] + v * end[1]);
    }
    for (int k = 1; k < s->count; k++)
        label[k] = fmax(label[k], label[k - 1] + APART);
    for (int k = 0; k < s->count; k++)
        fprintf(f, "<text x='%.1f' y='%.1f' text-anchor='middle'>%d ms</text>\n", label[k],
                y0 - scale * s->x[0][k][3 * s->beads - 1] + 22, s->ms[k]);
    free(s);
    return close_svg(f, path);
}

/* Parallel projection, from above at the long side: to the right, up, away; mm to px. */
struct view {
    double x, y, scale;
};

static void project(const struct view *v, const double *p, double *out)
{
    enum { RIGHT, UP, AWAY };
    const double a = .38, e = .5; /* rad: turned, lifted */
    const double back = -sin(a) * p[0] + cos(a) * p[1];
    out[RIGHT] = v->x + v->scale * (cos(a) * p[0] + sin(a) * p[1]);
    out[UP] = v->y - v->scale * (sin(e) * back + cos(e) * p[2]);
    out[AWAY] = cos(e) * back - sin(e) * p[2];
}

struct quad {
    double p[4][3], away;
};

static int farther(const void *a, const void *b)
{
    const double x = ((const struct quad *)a)->away, y = ((const struct quad *)b)->away;
    return x < y ? 1 : x > y ? -1 : 0;
}

/* Cells behind the middle of the sphere are drawn before it, the others after it, far ones first. */
static void draw_cloth(FILE *f, const struct view *v, const struct shapes *s, int k, int columns, int rows)
{
    static const int corner[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static struct quad quad[2][BEADS];
    const double radius = 100;
    int n = 0;
    for (int i = 0; i + 1 < columns; i++)
        for (int j = 0; j + 1 < rows; j++, n++)
            for (int p = 0; p < 2; p++) {
                quad[p][n].away = 0;
                for (int c = 0; c < 4; c++) {
                    project(v, s->x[p][k] + 3 * ((i + corner[c][0]) * rows + j + corner[c][1]), quad[p][n].p[c]);
                    quad[p][n].away += quad[p][n].p[c][2] / 4;
                }
            }
    for (int p = 0; p < 2; p++)
        qsort(quad[p], (size_t)n, sizeof **quad, farther);
    for (int front = 0; front < 2; front++) {
        for (int p = 0; p < 2; p++) {
            fprintf(f, "<g stroke-linejoin='round' %s>\n", p ? "fill='none' stroke='#08519c' stroke-width='.7'"
                                                             : "fill='#deebf7' stroke='#9ecae1' stroke-width='2.4'");
            for (int i = 0; i < n; i++) {
                const struct quad *q = &quad[p][i];
                if ((q->away < 0) != front) continue;
                fprintf(f, "<path d='M%.1f %.1fL%.1f %.1fL%.1f %.1fL%.1f %.1fz'/>\n", q->p[0][0], q->p[0][1], q->p[1][0],
                        q->p[1][1], q->p[2][0], q->p[2][1], q->p[3][0], q->p[3][1]);
            }
            fprintf(f, "</g>\n");
        }
        if (!front) fprintf(f, "<circle cx='%.1f' cy='%.1f' r='%.1f' fill='#eee' stroke='#bbb'/>\n", v->x, v->y, v->scale * radius);
    }
}

int picture_cloth(const char *path, const char *title, const char *run)
{
    enum { COLUMNS = 20, ROWS = 10, TOP = 62, CELL = 206, HEIGHT = TOP + 2 * CELL + 10 };
    struct shapes *s = shapes_read(run);
    if (!s || s->beads != COLUMNS * ROWS) return free(s), 0;
    FILE *f = open_svg(path, title, HEIGHT);
    if (!f) return free(s), -1;
    for (int k = 0; k < s->count; k++) {
        const struct view v = {WIDTH * (k % 3 + .5) / 3, TOP + CELL * (k / 3 + 0.) + 146, .56};
        fprintf(f, "<text x='%.1f' y='%d' text-anchor='middle'>%d ms</text>\n", v.x, TOP + CELL * (k / 3) + 14, s->ms[k]);
        draw_cloth(f, &v, s, k, COLUMNS, ROWS);
    }
    fprintf(f, "<rect x='592' y='18' width='22' height='16' fill='#deebf7' stroke='#9ecae1' stroke-width='2.4'/>"
               "<text x='622' y='30'>true</text>\n"
               "<rect x='660' y='18' width='22' height='16' fill='none' stroke='#08519c' stroke-width='.7'/>"
               "<text x='688' y='30'>predicted</text>\n");
    free(s);
    return close_svg(f, path);
}
