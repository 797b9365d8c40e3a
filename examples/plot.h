/* SPDX-License-Identifier: MIT */
/* plot.h - curves as SVG, a file of its own or a part of a page. Needs stdio.h, math.h, stdarg.h.

       svg_begin, svg_end    a picture
       svg_text              a line of text
       svg_curve             a curve in a frame
       svg_axes              the border of a frame, with ticks and units */

#ifndef PLOT_H
#define PLOT_H

/* Where curves are drawn, in pixels from the top left, and the ranges that it shows. */
typedef struct {
    FILE *f;
    double left, top, width, height, x[2], y[2];
} frame;

static const char *const svg_colours[] = {"#999", "#a63603", "#08519c", "#31733a"};
enum { GREY, RED, BLUE, GREEN };

/* alone: a file of its own, which names what it is. */
static void svg_begin(FILE *f, int width, int height, int alone)
{
    fprintf(f,
            "<svg%s width='%d' height='%d' viewBox='0 0 %d %d' font-family='Helvetica, Arial, sans-serif' font-size='12' "
            "fill='#222'>\n<rect width='%d' height='%d' fill='#fff'/>\n",
            alone ? " xmlns='http://www.w3.org/2000/svg'" : "", width, height, width, height, width, height);
}

static void svg_end(FILE *f)
{
    fprintf(f, "</svg>\n");
}

/* attributes: of the element, such as font-size='15'; the text is of ours, without < and &. */
static void svg_text(FILE *f, double x, double y, const char *attributes, const char *format, ...)
{
    va_list list;
    fprintf(f, "<text x='%.4g' y='%.4g'%s%s>", x, y, *attributes ? " " : "", attributes);
    va_start(list, format);
    vfprintf(f, format, list);
    va_end(list);
    fprintf(f, "</text>\n");
}

/* The curve y [count] over x; x NULL: over 0 .. count - 1. It has gaps where y is NaN, or lies farther out of the frame than 20
   pixels. */
static void svg_curve(const frame *p, const char *colour, double wide, int count, const double *x, const double *y)
{
    const int thin = count / 300 + 1;
    int i, pen = 0;
    fprintf(p->f, "<path fill='none' stroke-width='%g' stroke='%s' d='", wide, colour);
    for (i = 0; i < count; i += thin) {
        const double across = ((x ? x[i] : i) - p->x[0]) / (p->x[1] - p->x[0]), down = (p->y[1] - y[i]) / (p->y[1] - p->y[0]);
        const double off = down * p->height;
        if (!(off > -20 && off < p->height + 20)) {
            pen = 0;
            continue;
        }
        fprintf(p->f, "%c%.1f %.1f", pen ? 'L' : 'M', p->left + across * p->width, p->top + off);
        pen = 1;
    }
    fprintf(p->f, "'/>\n");
}

/* The range of x [count], which need not be finite, added to range, which is [1, -1] if it is empty. */
static void svg_extend(double *range, int count, const double *x)
{
    int i;
    for (i = 0; i < count; i++) {
        if (!isfinite(x[i])) continue;
        if (range[0] > range[1]) range[0] = range[1] = x[i];
        range[0] = fmin(range[0], x[i]), range[1] = fmax(range[1], x[i]);
    }
}

/* A range that has a width. */
static void svg_widen(double *range)
{
    const double least = 1e-9 + 1e-6 * fabs(range[0]);
    if (range[0] > range[1]) range[0] = 0, range[1] = 1;
    if (range[1] - range[0] < 2 * least) range[0] -= least, range[1] += least;
}

/* Border and ticks at round numbers; x_name, y_name with units. */
static void svg_axes(const frame *p, const char *x_name, const char *y_name)
{
    int k;
    fprintf(p->f, "<path stroke='#bbb' fill='none' d='M%.1f %.1fv%.1fh%.1f'/>\n", p->left, p->top, p->height, p->width);
    svg_text(p->f, p->left, p->top - 8, "", "%s", y_name);
    svg_text(p->f, p->left + p->width, p->top + p->height + 28, "text-anchor='end'", "%s", x_name);
    for (k = 0; k < 2; k++) {
        const double *range = k ? p->y : p->x, rough = (range[1] - range[0]) / 5, ten = pow(10, floor(log10(rough)));
        const double step = ten * (rough > 5 * ten ? 10 : rough > 2 * ten ? 5 : rough > ten ? 2 : 1);
        double i;
        for (i = ceil(range[0] / step); i * step <= range[1] * (1 + 1e-9); i++) {
            const double at = (i * step - range[0]) / (range[1] - range[0]);
            const double x = p->left + (k ? 0 : at * p->width), y = p->top + p->height - (k ? at * p->height : 0);
            fprintf(p->f, "<path stroke='%s' d='M%.1f %.1f%c%.1f'/>", k ? "#eee" : "#bbb", x, y, k ? 'h' : 'v', k ? p->width : 4);
            svg_text(p->f, k ? x - 4 : x, k ? y + 4 : y + 16, k ? "text-anchor='end'" : "text-anchor='middle'", "%.4g",
                     i * step + 0.0);
        }
    }
}

#endif
