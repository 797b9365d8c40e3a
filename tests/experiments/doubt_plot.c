/* SPDX-License-Identifier: MIT */
/* doubt_plot.c - errors and deviations over novelty as SVG: doubt_plot OUT.svg SYSTEM .. < lines

   Lines are `SYSTEM PART curve NOVELTY COUNT ERROR DEVIATION`, of parts all and hole; others are passed over. A frame for each
   SYSTEM has the errors of both as dots, and the deviations as lines. */
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>
#include "../../examples/plot.h"

enum { MOST = 100, PARTS = 2, SYSTEMS = 8 };

typedef struct {
    int count;
    double novelty[MOST], error[MOST], deviation[MOST]; /* log10 */
} curve;
static curve curves[SYSTEMS][PARTS];

static void read_curves(int systems, char **name)
{
    char line[1000], system[100], part[100];
    double x, count, e, d;
    while (fgets(line, sizeof line, stdin)) {
        int k;
        if (sscanf(line, "%99s %99s curve %lf %lf %lf %lf", system, part, &x, &count, &e, &d) != 6) continue;
        for (k = 0; k < systems; k++) {
            const int of = strcmp(part, "hole") == 0, at = curves[k][of].count;
            if (strcmp(system, name[k]) != 0 || at == MOST) continue;
            curves[k][of].novelty[at] = log10(x), curves[k][of].error[at] = log10(e), curves[k][of].deviation[at] = log10(d);
            curves[k][of].count = at + 1;
        }
    }
}

int main(int argc, char **argv)
{
    FILE *const f = argc > 2 && argc - 2 <= SYSTEMS ? fopen(argv[1], "w") : NULL;
    double x[2] = {1, -1}, y[2] = {1, -1}; /* the same of all frames */
    int k, of, i;
    if (!f) return fprintf(stderr, "doubt_plot OUT.svg SYSTEM ..\n"), 1;
    read_curves(argc - 2, argv + 2);
    for (k = 0; k < PARTS * SYSTEMS; k++) {
        const curve *const c = &curves[k / PARTS][k % PARTS];
        svg_extend(x, c->count, c->novelty), svg_extend(y, c->count, c->error), svg_extend(y, c->count, c->deviation);
    }
    svg_widen(x), svg_widen(y);
    svg_begin(f, 230 * (argc - 2) + 10, 290, 1);
    for (k = 0; k < argc - 2; k++) {
        const frame p = {f, 40 + 230 * k, 50, 180, 180, {x[0], x[1]}, {y[0], y[1]}};
        svg_text(f, p.left, 20, "font-size='15'", "%s", argv[2 + k]);
        svg_axes(&p, "log10 of novelty", k ? "" : "log10 of rms error, in deviations at novelty 1");
        for (of = 0; of < PARTS; of++) {
            const curve *const c = &curves[k][of];
            svg_curve(&p, svg_colours[2 - of], 1.5, c->count, c->novelty, c->deviation);
            for (i = 0; i < c->count; i++)
                fprintf(f, "<circle cx='%.1f' cy='%.1f' r='3' fill='%s'/>\n",
                        p.left + (c->novelty[i] - x[0]) / (x[1] - x[0]) * p.width,
                        p.top + (y[1] - c->error[i]) / (y[1] - y[0]) * p.height, svg_colours[2 - of]);
        }
    }
    svg_text(f, 40, 280, "fill='#08519c'", "all recordings: dots errors, line deviations");
    svg_text(f, 400, 280, "fill='#a63603'", "a region left out of the training");
    svg_end(f);
    return fclose(f) != 0;
}
