/* report.h - results of runs over their seeds, and pictures of them. */
#ifndef REPORT_H
#define REPORT_H

#include <stddef.h>

/* ---- report.c: the files DIR/NAME-SEED.txt ---- */

struct stat {
    int count;                                  /* seeds that have the value; 0: nothing else is set */
    double mean, deviation, median, least, most; /* a value that is not finite counts as infinity */
};

extern const char *result_dir;

/* `key argument VALUE` of the runs of a recipe. A missing `failed` beside an E_q is 0: it is only written if there are some. */
struct stat stat_of(const char *recipe, const char *key, const char *argument);
void recipe_few(char *name, size_t size, const char *pattern, const char *trajectories);    /* '*' of the pattern replaced */

/* ---- picture.c: SVG of 760 px; returns 0 and writes no file if there is nothing to show, 1 if it did, -1: cannot write ---- */

struct series {
    const char *label, *recipe, *colour, *dash; /* dash: of SVG, "" for a line */
};

/* Medians over the seeds, log axes. argument NULL: against the horizon; else against the training trajectories 5 .. 40 that
   stand for '*' in the recipes, with a bar from least to largest. */
struct panel {
    const char *title, *key, *argument;
    const struct series *series;
    int count;
};
int picture_curves(const char *path, const char *title, const struct panel *panel, int panels, int height);

/* The bead positions in DIR/RUN.path: the rope from the side, its instants in one frame; the cloth on its sphere. */
int picture_rope(const char *path, const char *title, const char *run);
int picture_cloth(const char *path, const char *title, const char *run);

#endif
