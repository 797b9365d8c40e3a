/* SPDX-License-Identifier: MIT */
/* page.h - OUT_report.html: all that a training found, on one page with pictures in it; no script, no other file.

   train.c includes it behind its checkpoint, report.h, baseline.h and fitted.h. Sections, in this order (`sections`):

       read        recordings: what the reader said of them
       training    command, config, settings
       curve       the learning curve
       errors      the tables of errors, and the regression beside them
       motion      recorded and predicted motion
       torques     recorded torques and those of the model, with slopes
       inertia     M and gravity along the range of each coordinate, and where recordings have been
       friction    friction over speed
       unknown     what the recordings cannot tell
       noise       noise of each column
       limits      limits of the guard, range of the model

   1 HTML     2 recordings and training     3 errors     4 mechanics     5 what is not known     6 the page */

#ifndef PAGE_H
#define PAGE_H

enum { DRAWN = 12 }; /* joints in pictures */

/* ---- 1 HTML ---- */

/* Bytes of the letter of UTF-8 that text begins with; 0: it is none, or cut off. */
static int letter_length(const char *text)
{
    const unsigned char c = (unsigned char)*text;
    const int n = c < 0x80 ? 1 : c < 0xc2 ? 0 : c < 0xe0 ? 2 : c < 0xf0 ? 3 : c < 0xf5 ? 4 : 0;
    int i;
    for (i = 1; i < n; i++)
        if (((unsigned char)text[i] & 0xc0) != 0x80) return 0;
    return c < ' ' && c != '\n' && c != '\t' ? 0 : n;
}

/* A text that may hold anything. */
static void put_text(FILE *f, const char *text)
{
    while (*text) {
        const int n = letter_length(text);
        if (*text == '<') fputs("&lt;", f);
        else if (*text == '>') fputs("&gt;", f);
        else if (*text == '&') fputs("&amp;", f);
        else if (n == 0) fputc('?', f);
        else fwrite(text, 1, (size_t)n, f);
        text += n > 0 ? n : 1;
    }
}

/* The header of a table; names are apart by |. */
static void put_head(FILE *f, const char *names)
{
    fputs("<table>\n<tr><th>", f);
    for (; *names; names++)
        if (*names == '|') fputs("</th><th>", f);
        else fputc(*names, f);
    fputs("</th></tr>\n", f);
}

/* A cell with a number; - if there is none. */
static void put_number(FILE *f, double x)
{
    if (isfinite(x)) fprintf(f, "<td>%.5g</td>", x);
    else fputs("<td>-</td>", f);
}

static void put_cell(FILE *f, const char *text)
{
    fputs("<td>", f), put_text(f, text), fputs("</td>", f);
}

static void put_paragraph(FILE *f, const char *format, ...)
{
    va_list list;
    fputs("<p>", f);
    va_start(list, format);
    vfprintf(f, format, list);
    va_end(list);
    fputs("</p>\n", f);
}

/* What coordinates with torques are called. */
static const char *coordinate(void)
{
    return JOINTS ? "joint" : "latent coordinate";
}

/* The unit of a torque of coordinate j. */
static const char *torque_unit(int j)
{
    return !(set("torque") > 0) ? "no unit" : JOINTS ? unit_of_column(OF_TAU, j) : "unit of tau times q";
}

/* ---- 2 recordings and training ---- */

static void put_read(FILE *f)
{
    int i;
    if (words[Q_COLUMNS].value)
        put_paragraph(
            f, "Units of the model: those of the column map (q=, qd=, tau=), in rad, m, s, Nm, N. A column without a unit is "
               "taken as it is.");
    else
        put_paragraph(
            f, "Units of the model: those of the files, whose columns are taken as they are, since there is no column map (q=). "
               "Times are in s.");
    fputs("<p>Held out: held=", f), put_text(f, words[HELD].value), fputs(". Files: ", f);
    for (i = 0; i < inputs.count; i++)
        fputs(i ? ", " : "", f), put_text(f, inputs.path[i]);
    fputs("</p>\n<pre>", f), put_text(f, transcript), fputs("</pre>\n", f);
}

/* A word of a command line, in quotes if a shell needs them. */
static void put_word(FILE *f, const char *word)
{
    static const char plain[] = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=.,:/%@";
    if (*word && word[strspn(word, plain)] == 0) {
        fputs(word, f);
        return;
    }
    fputc('\'', f);
    while (*word) {
        char letter[5] = "";
        const int n = letter_length(word) > 0 ? letter_length(word) : 1;
        memcpy(letter, word, (size_t)n), word += n;
        if (*letter == '\'') fputs("'\\''", f);
        else put_text(f, letter);
    }
    fputc('\'', f);
}

/* A line of the header of weights that tells a part of the config: NAME_weights_are_of_ROLN_MLP_16_16[ becomes ROLN_MLP: 16 16. */
static void put_part_of_config(FILE *f, const char *line)
{
    static const char mark[] = "_weights_are_of_ROLN_";
    const char *at = strstr(line, mark);
    int words_of = 0;
    if (!at) return;
    fputs("ROLN_", f);
    for (at += sizeof mark - 1; *at && *at != '['; at++)
        if (*at != '_') fputc(*at, f);
        else fputs(words_of++ ? " " : ": ", f);
    fputc('\n', f);
}

/* Of a header of weights, which comes in pieces: ctx is a file. */
static void put_config(void *ctx, const char *text)
{
    static char line[200];
    static size_t length;
    for (; *text; text++) {
        if (*text != '\n' && length + 1 < sizeof line) line[length++] = *text;
        if (*text != '\n') continue;
        line[length] = 0, length = 0;
        put_part_of_config((FILE *)ctx, line);
    }
}

static void put_settings(FILE *f)
{
    int i;
    put_head(f, "setting|value|what it is");
    for (i = 0; i < WORDS; i++) {
        if (!words[i].value) continue;
        fprintf(f, "<tr><td>%s</td>", words[i].key), put_cell(f, words[i].value), put_cell(f, words[i].help), fputs("</tr>\n", f);
    }
    for (i = 0; i < SETTINGS; i++) {
        fprintf(f, "<tr><td>%s</td><td>%g</td>", settings[i].key, settings[i].value), put_cell(f, settings[i].help);
        fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

static void put_training(FILE *f)
{
    int seed = 0, i;
    fputs(set("resume") > 0 ? "<p>This run went on from a checkpoint of another command, by:</p>\n<pre>"
                            : "<p>The same command trains the same model:</p>\n<pre>",
          f);
    for (i = 0; i < argument_count; i++) {
        seed += strncmp(arguments[i], "seed=", 5) == 0;
        fputs(i ? " " : "", f), put_word(f, arguments[i]);
    }
    if (!seed) fprintf(f, " seed=%.0f", set("seed"));
    fputs("</pre>\n", f);
    if (ended[0]) {
        fputs("<p>This run was ended by ", f), put_text(f, ended);
        fprintf(f, " at step %d, which another run may not reach in the same time.</p>\n", reached);
    }
    if (set("seconds") > 0) put_paragraph(f, "With seconds= the bits of the weights depend on the speed of the machine.");
    put_paragraph(f,
                  "N = %d joints, n = %d coordinates, %d parameters; %d of %d recordings held out; weights of step %d. "
                  "The config:",
                  (int)M(N), (int)M(n), (int)M(theta_size), d.trajectories - train, d.trajectories, s.best_step);
    fputs("<pre>", f);
    (void)M(write)(&s.p, put_config, f);
    fputs("</pre>\n", f);
    put_settings(f);
}

/* ---- 3 errors ---- */

static void put_curve_section(FILE *f)
{
    if (s.points == 0) {
        put_paragraph(f, "There was no look at the held-out recordings.");
        return;
    }
    put_paragraph(f, "E_q is the error of the predicted joints over the spread of the joints. The mean of q has 100 %%.");
    put_curve(f, 0);
}

/* One table of errors: the numbers of OUT_errors.csv. */
static void put_errors_of(FILE *f, int at)
{
    int i, j;
    fputs("<h3>", f), put_text(f, kept_tables[at].name), fputs("</h3>\n", f);
    put_head(f, "ms|E_q %|+-|median %|90 %|q + h qd %|counts|E_qd %|+-|worst joint|its E_q %|its rms|failed|windows");
    for (i = 0; i < kept_tables[at].rows; i++) {
        const error *e = &kept_tables[at].row[i].e;
        fputs("<tr>", f);
        put_number(f, kept_tables[at].row[i].ms), put_number(f, 100 * e->q), put_number(f, 100 * e->q_error);
        put_number(f, 100 * e->median), put_number(f, 100 * e->tenth);
        put_number(f, 100 * e->constant), put_cell(f, kept_tables[at].row[i].counts ? "yes" : "no");
        put_number(f, 100 * e->qd), put_number(f, 100 * e->qd_error), put_number(f, e->worst + 1);
        put_number(f, 100 * e->joint_q[e->worst]), put_number(f, e->joint_rms[e->worst]);
        put_number(f, e->failed), put_number(f, e->windows), fputs("</tr>\n", f);
    }
    fputs("</table>\n<p>E_q in % and rms of q of each joint:</p>\n", f);
    fputs("<table>\n<tr><th>ms</th>", f);
    for (j = 0; j < (int)M(N); j++)
        fprintf(f, "<th>E_q%d %%</th><th>rms %d, %s</th>", j + 1, j + 1, unit_of_column(OF_Q, j));
    fputs("</tr>\n", f);
    for (i = 0; i < kept_tables[at].rows; i++) {
        const error *e = &kept_tables[at].row[i].e;
        fputs("<tr>", f), put_number(f, kept_tables[at].row[i].ms);
        for (j = 0; j < (int)M(N); j++)
            put_number(f, 100 * e->joint_q[j]), put_number(f, e->joint_rms[j]);
        fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

static void put_errors(FILE *f)
{
    int k;
    put_paragraph(f,
                  "E_q, E_qd: rms errors after a time over the rms of motion. +-: standard error. median, 90 %%: half of the "
                  "windows, and nine in ten, stay below. q + h qd: a constant velocity, which needs no model; a horizon counts if "
                  "its error is more than noise and chart leave. rms in the unit of q.");
    for (k = 0; k < tables_kept; k++)
        put_errors_of(f, k);
    if (!fitted) {
        put_paragraph(f, "There is no regression beside this model: it needs torque=1 and coordinates that are the joints.");
        return;
    }
    fputs("<h3>The regression on the held-out recordings</h3>\n", f);
    put_head(f, "ms|E_q %|failed|windows");
    for (k = 0; k < 2; k++) {
        const regression_error *e = &baseline_ahead[k].e;
        if (!(baseline_ahead[k].ms > 0)) continue;
        fputs("<tr>", f), put_number(f, baseline_ahead[k].ms);
        put_number(f, e->windows > e->failed ? 100 * e->q : (double)NAN), put_number(f, e->failed), put_number(f, e->windows);
        fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

static void put_motion_section(FILE *f)
{
    if (!shown_motion[0].x) {
        put_paragraph(f, "There was no time to predict whole recordings.");
        return;
    }
    if ((int)M(N) > (int)DRAWN) put_paragraph(f, "The %d joints that move most.", (int)DRAWN);
    put_motion(f, DRAWN, 0);
}

/* ---- 4 mechanics ---- */

/* Slope and intercept of recorded torques over those of the model. */
static void put_torque_table(FILE *f)
{
    const torque_sums *t = &held_torques;
    const double n = t->samples;
    int j;
    put_head(f, JOINTS ? "joint|unit|rms tau|rms error|%|of the regression, %|slope|intercept"
                       : "latent|unit|rms tau|rms error|%|of the regression, %|slope|intercept");
    for (j = 0; j < TORQUES; j++) {
        const double spread = t->model[j] - t->mean_model[j] * t->mean_model[j] / n;
        const double slope = (t->both[j] - t->mean[j] * t->mean_model[j] / n) / spread;
        fprintf(f, "<tr><td>%d</td>", j + 1), put_cell(f, torque_unit(j)), put_number(f, sqrt(t->tau[j] / n));
        put_number(f, sqrt(t->off[j] / n)), put_number(f, 100 * sqrt(t->off[j] / t->tau[j]));
        put_number(f, baseline_ahead[0].ms > 0 ? 100 * baseline_ahead[0].e.tau[j] : (double)NAN);
        put_number(f, slope), put_number(f, (t->mean[j] - slope * t->mean_model[j]) / n), fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

/* A frame of one of two columns. */
static frame frame_of(FILE *f, int column, int row)
{
    frame p = {f, 70, 40, 350, 110, {1, -1}, {1, -1}};
    p.left += 440 * column, p.top += 180 * row;
    return p;
}

/* Recorded and predicted torque of every coordinate in one recording, in a column of a picture. */
static void put_torques_of(FILE *f, int at, int column)
{
    enum { T = TORQUES, SHOWN = T < (int)DRAWN ? T : (int)DRAWN };
    const int a = d.first[at], step = (d.first[at + 1] - a) / 300 + 1, most = (d.first[at + 1] - a) / step + 1;
    double *x = room((size_t)(1 + 2 * SHOWN) * (size_t)most, sizeof *x), tau[T], model[T], speed[T];
    int count = 0, i, j;
    for (i = a + 1; i + 1 < d.first[at + 1]; i += step, count++) {
        const int good = torques_at(&s.p, &d, i, tau, model, NULL, speed);
        x[count] = (i - a) * d.dt;
        for (j = 0; j < SHOWN; j++) {
            x[(1 + j) * most + count] = good ? tau[j] : (double)NAN;
            x[(1 + SHOWN + j) * most + count] = good ? model[j] : (double)NAN;
        }
    }
    for (j = 0; j < SHOWN; j++) {
        frame p = frame_of(f, column, j);
        char name[80];
        snprintf(name, sizeof name, "%s %d, %s", coordinate(), j + 1, torque_unit(j));
        svg_extend(p.x, count, x);
        svg_extend(p.y, count, x + (1 + j) * most), svg_extend(p.y, count, x + (1 + SHOWN + j) * most);
        svg_widen(p.x), svg_widen(p.y), svg_axes(&p, "s", name);
        svg_curve(&p, svg_colours[GREY], 2, count, x, x + (1 + j) * most);
        svg_curve(&p, svg_colours[RED], 1, count, x, x + (1 + SHOWN + j) * most);
    }
    free(x);
}

static void put_torques(FILE *f)
{
    const int rows = TORQUES < (int)DRAWN ? TORQUES : (int)DRAWN;
    if (!(set("torque") > 0) || held_torques.samples == 0) {
        put_paragraph(f, "%s",
                      set("torque") > 0 ? "The model has no finite torques at held-out samples."
                                        : "torque=0: no torques were trained with.");
        return;
    }
    put_paragraph(
        f,
        "Inverse dynamics at %d held-out samples. Slope and intercept are those of recorded over predicted torque: 1 and 0 "
        "of a model without error. A slope near 0 means that the model predicts torques which are not there.",
        held_torques.samples);
    put_torque_table(f);
    put_paragraph(f, "Grey recorded, red predicted; left the median recording, right the worst.");
    svg_begin(f, 880, 180 * rows + 10, 0);
    put_torques_of(f, shown_motion[0].x ? shown_motion[0].at : train, 0);
    put_torques_of(f, shown_motion[1].x ? shown_motion[1].at : d.trajectories - 1, 1);
    svg_end(f);
}

/* Coordinate j as it is drawn: q of a joint, or z. */
static double place_of(M(latent) z, int j)
{
    static M(work) scratch;
    M(state) x;
    if (!JOINTS) return (double)z.z[j];
    return M(decode)(&s.p, &z, &x, &scratch.decode) == ROLN_OK ? (double)x.q[j] : (double)NAN;
}

enum { PLACES = 121 };

/* Two functions of one coordinate. */
typedef struct {
    double x[PLACES], y[2][PLACES];
    int seen[PLACES]; /* nonzero: recorded motion has been there */
} curve;

/* Where joint j has been, of places c->x at equal distances. Of a latent coordinate these are all. */
static void mark_seen(curve *c, int j)
{
    const double low = c->x[0], wide = c->x[PLACES - 1] - low, turn = 2 * acos(-1.0);
    int i;
    for (i = 0; i < PLACES; i++)
        c->seen[i] = !JOINTS;
    for (i = 0; i < d.samples && JOINTS && wide > 0; i++) {
        const double q = (double)d.q[i * (int)M(N) + j] - low;
        const double at = floor((roln_lnn_angle(&M(model).lnn, j) ? q - turn * floor(q / turn) : q) / wide * (PLACES - 1) + 0.5);
        if (at >= 0 && at < PLACES) c->seen[(int)at] = 1;
    }
}

/* One of the functions in a frame with axes: blue where recorded motion has been, else grey. */
static void put_plot(FILE *f, int column, int row, const curve *c, int which, const char *x_name, const char *y_name)
{
    frame p = frame_of(f, column, row);
    double y[PLACES];
    int i;
    for (i = 0; i < PLACES; i++)
        y[i] = c->seen[i] ? c->y[which][i] : (double)NAN;
    svg_extend(p.x, PLACES, c->x), svg_extend(p.y, PLACES, c->y[which]);
    if (p.y[0] > 0) p.y[0] = 0; /* of an inertia */
    svg_widen(p.x), svg_widen(p.y), svg_axes(&p, x_name, y_name);
    svg_curve(&p, svg_colours[GREY], 1, PLACES, c->x, c->y[which]);
    svg_curve(&p, svg_colours[BLUE], 2, PLACES, c->x, y);
}

static void put_inertia(FILE *f)
{
    const int rows = TORQUES < (int)DRAWN ? TORQUES : (int)DRAWN;
    static curve c;
    int i, j;
    put_paragraph(f, "Along the range of each %s, with the others in the middle of theirs; grey: where no recording has been.%s",
                  coordinate(), set("torque") > 0 ? "" : " torque=0: M and gravity are known up to a common factor.");
    svg_begin(f, 880, 180 * rows + 10, 0);
    for (j = 0; j < rows; j++) {
        const double low = (double)s.p.z_min[j], high = (double)s.p.z_max[j];
        char x_name[80], y_name[2][120];
        for (i = 0; i < PLACES; i++) {
            M(latent) z = middle();
            terms t;
            z.z[j] = (roln_real)(low + (high - low) * i / (PLACES - 1));
            t = terms_at(z, j, 0);
            c.x[i] = place_of(z, j), c.y[0][i] = t.column[j], c.y[1][i] = t.gravity;
        }
        mark_seen(&c, j);
        snprintf(x_name, sizeof x_name, "%s %d, %s", coordinate(), j + 1, JOINTS ? unit_of_column(OF_Q, j) : "z");
        snprintf(y_name[0], sizeof y_name[0], "M %d,%d: torque (%s) over acceleration", j + 1, j + 1, torque_unit(j));
        snprintf(y_name[1], sizeof y_name[1], "gravity torque of %s %d, %s", coordinate(), j + 1, torque_unit(j));
        put_plot(f, 0, j, &c, 0, x_name, y_name[0]);
        put_plot(f, 1, j, &c, 1, x_name, y_name[1]);
    }
    svg_end(f);
}

/* The largest recorded speed of coordinate j. */
static double top_speed(int j)
{
    double top = 0;
    int i;
    if (!JOINTS) return (double)s.p.zd_max[j];
    for (i = 0; i < d.samples; i++)
        top = fmax(top, fabs((double)d.qd[i * (int)M(N) + j]));
    return top;
}

static void put_friction(FILE *f)
{
    const int rows = TORQUES < (int)DRAWN ? TORQUES : (int)DRAWN;
    static curve c;
    int i, j;
    if (!M(model).lnn.damping && !M(model).lnn.friction) {
        put_paragraph(f, "The config has neither ROLN_DAMPING nor ROLN_FRICTION: the model has no friction.");
        return;
    }
    put_paragraph(f, "Damping%s of each %s that moves alone, in the middle of the range.",
                  M(model).lnn.friction ? " and dry friction" : " (no ROLN_FRICTION)", coordinate());
    svg_begin(f, 880, 180 * ((rows + 1) / 2) + 10, 0);
    for (j = 0; j < rows; j++) {
        const double top = top_speed(j);
        char name[2][80];
        for (i = 0; i < PLACES; i++) {
            c.x[i] = top * (2.0 * i / (PLACES - 1) - 1), c.seen[i] = 1;
            c.y[0][i] = terms_at(middle(), j, c.x[i]).friction;
        }
        snprintf(name[0], sizeof name[0], "qd, %s", JOINTS ? unit_of_column(OF_QD, j) : "zd");
        snprintf(name[1], sizeof name[1], "%s %d: friction, %s", coordinate(), j + 1, torque_unit(j));
        put_plot(f, j % 2, j / 2, &c, 0, name[0], name[1]);
    }
    svg_end(f);
}

/* ---- 5 what is not known ---- */

/* What the model itself tells: inertial torques below its error. Returns how much was said. */
static int put_hidden(FILE *f)
{
    const int step = (d.samples - d.first[train]) / 1000 + 1;
    double tau[TORQUES], model[TORQUES], part[TORQUES], speed[TORQUES], inertial[TORQUES] = {0}, off[TORQUES] = {0};
    int said = 0, count = 0, k, i, j;
    for (k = train; k < d.trajectories && set("torque") > 0; k++)
        for (i = d.first[k] + 1; i + 1 < d.first[k + 1]; i += step) {
            if (!torques_at(&s.p, &d, i, tau, model, part, speed)) continue;
            for (count++, j = 0; j < TORQUES; j++)
                inertial[j] += part[j] * part[j], off[j] += (model[j] - tau[j]) * (model[j] - tau[j]);
        }
    for (j = 0; j < TORQUES && count > 0; j++)
        if (inertial[j] < off[j]) {
            fprintf(f, "<li>%s %d: inertial torque is below its noise: rms of M qdd %.3g, of the torque error %.3g.</li>\n",
                    coordinate(), j + 1, sqrt(inertial[j] / count), sqrt(off[j] / count));
            said++;
        }
    return said;
}

static void put_unknown(FILE *f)
{
    int said = 0, j;
    fputs("<ul>\n", f);
    for (j = 0; j < (int)M(N); j++)
        if (!changes(&d, d.q, M(N), j)) fprintf(f, "<li>joint %d does not move in any recording.</li>\n", j + 1), said++;
    if (!(set("torque") > 0)) fputs("<li>torque=0: the unit of M, gravity and friction.</li>\n", f), said++;
    said += put_hidden(f);
    for (j = 0; j < (int)M(n); j++)
        if (!(s.p.zd_max[j] > 0)) fprintf(f, "<li>coordinate %d has no speed in any recording.</li>\n", j + 1), said++;
    fputs("<li>States outside of the range of training, below under limits.</li>\n</ul>\n", f);
    if (said == 0) put_paragraph(f, "Inertial torques are above the torque error, and every joint moves.");
    if (!fitted) return;
    put_paragraph(f,
                  "The regression of the training recordings, and how many of its numbers these tell (its rank beside the ridge):");
    fputs("<pre>", f), regression_tell(&baseline, f), fputs("</pre>\n", f);
}

static void put_noise_section(FILE *f)
{
    int c;
    put_paragraph(
        f, "White noise that the spectrum of a column shows before any filter. The last column is its part in what a training "
           "needs: the acceleration, or the torque. -: the spectrum shows none.");
    put_head(f, "column|name|is|unit|deviation|unit of the model|part, %");
    for (c = 0; c < d.count; c++) {
        const field *x = &d.fields[c];
        if (x->kind == OF_T) continue;
        fputs("<tr>", f), put_number(f, x->column), put_cell(f, x->name);
        fprintf(f, "<td>%s%d</td>", kind_names[x->kind], x->index + 1), put_cell(f, *x->unit ? x->unit : "as it is");
        put_number(f, x->noise > 0 ? x->noise : (double)NAN), put_cell(f, unit_of_column(x->kind, x->index));
        put_number(f, x->share > 0 ? 100 * x->share : (double)NAN), fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

/* One line of the table of limits. */
static void put_limit(FILE *f, const char *name, double x, const char *unit)
{
    fprintf(f, "<tr><td>%s</td>", name), put_number(f, x), put_cell(f, unit), fputs("</tr>\n", f);
}

static void put_limits_section(FILE *f)
{
    const roln_limits *l = &found.limits;
    int j;
    if (found.no_evidence) put_paragraph(f, "Nothing is known of doubt: %s", found.no_evidence);
    if (found.no_limits) put_paragraph(f, "No limits of a guard could be fitted: %s", found.no_limits);
    if (found.no_noise) put_paragraph(f, "No noise of a filter could be fitted: %s", found.no_noise);
    put_paragraph(f, "Fitted to held-out recordings, as OUT_limits.h has it:");
    put_head(f, "limit|value|unit");
    if (!found.no_limits) {
        put_limit(f, "dt", (double)l->dt, "s"), put_limit(f, "margin", (double)l->margin, "part of the range");
        put_limit(f, "residual", (double)l->residual, power_unit());
        put_limit(f, "q_tolerance", (double)l->q_tolerance, "unit of q");
        put_limit(f, "qd_tolerance", (double)l->qd_tolerance, "unit of qd");
        if (l->evidence) put_limit(f, "novelty", (double)l->novelty, "1 is usual");
        for (j = 0; j < (int)M(force_size) && l->tau_each; j++) {
            char name[40];
            snprintf(name, sizeof name, "tau %d", j + 1), put_limit(f, name, (double)found.tau[j], unit_of_column(OF_TAU, j));
            snprintf(name, sizeof name, "rate %d", j + 1), put_limit(f, name, (double)found.rate[j], "the same per s");
        }
    }
    for (j = 0; j < (int)M(N) && !found.no_noise; j++) {
        char name[40];
        snprintf(name, sizeof name, "noise of q %d", j + 1), put_limit(f, name, (double)found.q[j], unit_of_column(OF_Q, j));
    }
    if (!found.no_noise)
        put_limit(f, "noise of torque", (double)found.noise.tau, set("torque") > 0 ? unit_of_column(OF_TAU, 0) : "of the model");
    fputs("</table>\n<p>The range of training, outside of which nothing is known of the model:</p>\n", f);
    put_head(f, "latent coordinate|from|to|largest speed");
    for (j = 0; j < (int)M(n); j++) {
        fprintf(f, "<tr><td>%d</td>", j + 1), put_number(f, (double)s.p.z_min[j]), put_number(f, (double)s.p.z_max[j]);
        put_number(f, (double)s.p.zd_max[j]), fputs("</tr>\n", f);
    }
    fputs("</table>\n", f);
}

/* ---- 6 the page ---- */

static const struct {
    const char *id, *title;
    void (*put)(FILE *f);
} sections[] = {
    {"read", "What was read", put_read},
    {"training", "The training", put_training},
    {"curve", "Learning curve", put_curve_section},
    {"errors", "Errors on recordings", put_errors},
    {"motion", "Motion, recorded and predicted", put_motion_section},
    {"torques", "Torques, recorded and predicted", put_torques},
    {"inertia", "Inertia and gravity", put_inertia},
    {"friction", "Friction", put_friction},
    {"unknown", "What the recordings cannot tell", put_unknown},
    {"noise", "Noise of the recordings", put_noise_section},
    {"limits", "Limits", put_limits_section},
};
enum { SECTIONS = sizeof sections / sizeof *sections };

static const char page_style[] =
    "body { font: 15px/1.5 Helvetica, Arial, sans-serif; color: #222; max-width: 60em; margin: 2em auto; padding: 0 1em }\n"
    "h2 { border-bottom: 1px solid #ddd; margin-top: 2em }\n"
    "pre { background: #f6f6f6; padding: 0.8em; overflow-x: auto; font-size: 13px; line-height: 1.35 }\n"
    "table { border-collapse: collapse; font-size: 13px; display: block; overflow-x: auto }\n"
    "th, td { padding: 0.15em 0.7em; text-align: right; border-bottom: 1px solid #eee }\n"
    "td:last-child { text-align: left }\n"
    "svg { max-width: 100%; height: auto }\n"
    ".good { color: #31733a } .bad { color: #a63603 }\n";

/* OUT_report.html; verdict: why there is no trained model, NULL: there is one. */
static void write_page(const char *verdict)
{
    FILE *f = file(".part", "w");
    int i;
    if (!f) return;
    fprintf(f,
            "<!DOCTYPE html>\n<html lang='en'>\n<head>\n<meta charset='utf-8'/>\n<title>" STRING(
                MODEL) "</title>\n<style>\n%s</style>\n</head>\n<body>\n<h1>" STRING(MODEL) "</h1>\n",
            page_style);
    fprintf(f, "<p class='%s'>%s", verdict ? "bad" : "good", verdict ? "No trained model: " : "A model was trained.");
    put_text(f, verdict ? verdict : "");
    fputs("</p>\n<ul>\n", f);
    for (i = 0; i < SECTIONS; i++)
        fprintf(f, "<li><a href='#%s'>%s</a></li>\n", sections[i].id, sections[i].title);
    fputs("</ul>\n", f);
    for (i = 0; i < SECTIONS; i++) {
        fprintf(f, "<section id='%s'>\n<h2>%s</h2>\n", sections[i].id, sections[i].title);
        sections[i].put(f);
        fputs("</section>\n", f);
    }
    fputs("</body>\n</html>\n", f);
    put_in_place(f, "_report.html");
}

#endif
