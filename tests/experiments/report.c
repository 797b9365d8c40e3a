/* report.c - OUTDIR/RESULTS.md and its pictures, from the result files of the runs in DIR.

     report DIR OUTDIR

   DIR holds NAME-SEED.txt (lines `key argument value`), NAME-SEED.path of rope and cloth, and speed.md, a table; what is missing
   is left open. Text that explains is not written here: a section `## heading` of OUTDIR/notes.md goes under the heading of the
   same words. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "recipes.h"
#include "report.h"

#define COUNT(a) ((int)(sizeof(a) / sizeof *(a)))

enum { MOST_SEEDS = 9, MOST_GROUPS = 256 };

/* ---- results ---- */

const char *result_dir;

struct value {
    char key[64], argument[128];
    double x;
};

struct run {
    struct value *value;
    int count;
};

/* The runs of a recipe, read when it is first asked for. */
struct group {
    char name[64];
    int count;
    struct run run[MOST_SEEDS];
    int seed[MOST_SEEDS];
};

static void add(struct run *r, const char *key, const char *argument, double x)
{
    r->value = realloc(r->value, (size_t)(r->count + 1) * sizeof *r->value);
    if (!r->value) perror("report"), exit(1);
    struct value *v = &r->value[r->count++];
    snprintf(v->key, sizeof v->key, "%s", key), snprintf(v->argument, sizeof v->argument, "%s", argument);
    v->x = x;
}

static int run_read(struct run *r, const char *name)
{
    char path[512], line[512], key[64], argument[64];
    double x;
    snprintf(path, sizeof path, "%s/%s.txt", result_dir, name);
    FILE *f = fopen(path, "r");
    while (f && fgets(line, sizeof line, f))
        if (sscanf(line, "%63s %63s %lf", key, argument, &x) == 3) add(r, key, argument, x);
    if (f) fclose(f);
    return r->count > 0;
}

/* What the table speed.md calls `**reduced**, 12 times` or `**MuJoCo**, 12 times`: 12, 1/12, under its column and its row. */
static int speed_read(struct run *r)
{
    enum { COLUMNS = 12 };
    char path[512], line[2048], head[COLUMNS][64] = {""}, row[128] = "";
    int heads = 0;
    double x;
    snprintf(path, sizeof path, "%s/speed.md", result_dir);
    FILE *f = fopen(path, "r");
    while (f && fgets(line, sizeof line, f)) {
        int n = 0;
        for (char *c = *line == '|' ? strtok(line, "|") : NULL; c && n < COLUMNS; c = strtok(NULL, "|"), n++) {
            if (heads == 0) sscanf(c, " %63[^\n]", head[n]);
            else if (n == 0) sscanf(c, " %127[^\n]", row);
            else if (sscanf(c, " **reduced**, %lf times", &x) == 1) add(r, head[n], row, x);
            else if (sscanf(c, " **MuJoCo**, %lf times", &x) == 1) add(r, head[n], row, 1 / x);
            for (char *t = n == 0 ? row : head[n], *e = t + strlen(t); e > t && e[-1] == ' ';)
                *--e = 0;
        }
        if (n > 0) heads = n;
    }
    if (f) fclose(f);
    return r->count > 0;
}

static const struct group *group_of(const char *name)
{
    static struct group group[MOST_GROUPS];
    static int groups;
    char run[96];
    for (int i = 0; i < groups; i++)
        if (strcmp(name, group[i].name) == 0) return &group[i];
    if (groups == MOST_GROUPS) fprintf(stderr, "report: too many recipes\n"), exit(1);
    struct group *g = &group[groups++];
    snprintf(g->name, sizeof g->name, "%s", name);
    if (strcmp(name, "speed") == 0) return g->count = speed_read(&g->run[0]), g;
    for (int seed = 1; seed <= MOST_SEEDS; seed++) {
        snprintf(run, sizeof run, "%s-%d", name, seed);
        if (run_read(&g->run[g->count], run)) g->seed[g->count++] = seed;
    }
    return g;
}

static const double *find(const struct run *r, const char *key, const char *argument)
{
    for (int i = 0; i < r->count; i++)
        if (strcmp(key, r->value[i].key) == 0 && strcmp(argument, r->value[i].argument) == 0) return &r->value[i].x;
    return NULL;
}

static int values(const char *recipe, const char *key, const char *argument, double x[MOST_SEEDS])
{
    const struct group *g = group_of(recipe);
    const char *failed = strstr(key, "failed");
    char beside[32];
    int n = 0;
    for (int i = 0; i < g->count; i++) {
        const double *v = find(&g->run[i], key, argument);
        if (v) x[n++] = isfinite(*v) ? *v : HUGE_VAL;
        else if (failed) {
            snprintf(beside, sizeof beside, "%.*sE_q", (int)(failed - key), key);
            if (find(&g->run[i], beside, argument)) x[n++] = 0;
        }
    }
    return n;
}

struct stat stat_of(const char *recipe, const char *key, const char *argument)
{
    struct stat s = {0, 0, 0, 0, 0, 0};
    double x[MOST_SEEDS];
    s.count = values(recipe, key, argument, x);
    if (s.count == 0) return s;
    for (int i = 1; i < s.count; i++)
        for (int j = i; j > 0 && x[j] < x[j - 1]; j--) {
            const double y = x[j];
            x[j] = x[j - 1], x[j - 1] = y;
        }
    s.least = x[0], s.most = x[s.count - 1];
    s.median = s.count % 2 ? x[s.count / 2] : (x[s.count / 2 - 1] + x[s.count / 2]) / 2;
    s.mean = x[0];
    if (s.least == s.most) return s;
    for (int i = 1; i < s.count; i++)
        s.mean += (x[i] - s.mean) / (i + 1);
    if (!isfinite(s.most)) s.mean = s.most;
    for (int i = 0; i < s.count && isfinite(s.most); i++)
        s.deviation += (x[i] - s.mean) * (x[i] - s.mean) / (s.count - 1);
    s.deviation = sqrt(s.deviation);
    return s;
}

void recipe_few(char *name, size_t size, const char *pattern, const char *trajectories)
{
    const char *star = strchr(pattern, '*');
    if (star) snprintf(name, size, "%.*s%s%s", (int)(star - pattern), pattern, trajectories, star + 1);
    else snprintf(name, size, "%s", pattern);
}

/* ---- numbers ---- */

/* So many significant digits, no exponent between .001 and a million. */
static char *number(char *s, size_t size, double x, int digits)
{
    char e[32];
    if (!isfinite(x)) return snprintf(s, size, "inf"), s;
    snprintf(e, sizeof e, "%.*e", digits - 1, x);
    char *mantissa_end = strchr(e, 'e');
    const int power = atoi(mantissa_end + 1);
    *mantissa_end = 0;
    if (x == 0) snprintf(s, size, "0");
    else if (power < -3 || power > 5) snprintf(s, size, "%.16se%d", e, power);
    else snprintf(s, size, "%.*f", power < digits - 1 ? digits - 1 - power : 0, x);
    return s;
}

/* mean ± standard deviation (median); one value if there is but one. */
static char *cell(char *s, size_t size, const struct stat *v, int digits)
{
    char mean[32], deviation[32], median[32];
    number(mean, sizeof mean, v->mean, digits), number(median, sizeof median, v->median, digits);
    number(deviation, sizeof deviation, v->deviation, 2);
    if (v->count == 0) snprintf(s, size, "-");
    else if (!isfinite(v->mean)) snprintf(s, size, v->count > 1 ? "inf (%s)" : "inf", median);
    else if (v->deviation == 0) snprintf(s, size, "%s", mean);
    else snprintf(s, size, "%s ± %s (%s)", mean, deviation, median);
    return s;
}

/* ---- headings and the text under them ---- */

struct notes {
    char *text;
    char used[4096]; /* headings that stood in the report, a line each */
};

static struct notes notes;

static void notes_read(const char *path)
{
    FILE *f = fopen(path, "r");
    size_t n = 0;
    notes.text = calloc(1, 1 << 18);
    if (!notes.text) exit(1);
    if (f) n = fread(notes.text, 1, (1 << 18) - 1, f), fclose(f);
    notes.text[n] = 0;
}

/* Between the line `## heading` and the next `## `. */
static void note(FILE *f, const char *heading)
{
    const size_t length = strlen(heading);
    const char *p = notes.text;
    while (p && (strncmp(p, "## ", 3) != 0 || strncmp(p + 3, heading, length) != 0 || p[3 + length] != '\n'))
        p = strchr(p, '\n'), p = p ? p + 1 : NULL;
    if (!p) return;
    const size_t have = strlen(notes.used);
    snprintf(notes.used + have, sizeof notes.used - have, "%s\n", heading);
    const char *begin = p + 3 + length, *end = strstr(begin, "\n## ");
    if (!end) end = begin + strlen(begin);
    while (begin < end && *begin == '\n')
        begin++;
    while (end > begin && end[-1] == '\n')
        end--;
    if (end > begin) fprintf(f, "%.*s\n\n", (int)(end - begin), begin);
}

/* Notes whose heading the report does not have. */
static void notes_left(void)
{
    char heading[256], line[260];
    for (const char *p = notes.text; p; p = strchr(p, '\n'), p = p ? p + 1 : NULL)
        if (strncmp(p, "## ", 3) == 0 && sscanf(p + 3, "%255[^\n]", heading) == 1) {
            snprintf(line, sizeof line, "%s\n", heading);
            if (!strstr(notes.used, line)) fprintf(stderr, "notes.md: no heading `%s`\n", heading);
        }
}

static void section(FILE *f, const char *heading)
{
    fprintf(f, "## %s\n\n", heading);
    note(f, heading);
}

static void picture(FILE *f, int drawn, const char *alt, const char *name)
{
    if (drawn < 0) exit(1);
    if (drawn) fprintf(f, "![%s](%s)\n\n", alt, name);
}

/* ---- tables ---- */

/* key, if any, replaces the key E_q of columns and empties the others; argument, if any, that of all columns. */
struct row {
    const char *label, *recipe, *key, *argument;
};

/* few: stands for '*' in the recipe of the row; optional: only shown if it has a value. */
struct column {
    const char *heading, *key, *argument;
    int digits, optional;
    const char *few;
};

struct table {
    const char *title;
    const struct row *row;
    int rows;
    const struct column *column;
    int columns;
};

#define ROW(label, recipe) {label, recipe, NULL, NULL}
#define TRIVIAL(recipe) {"q + h qd", recipe, "trivial", NULL}
#define AT(label, recipe, argument) {label, recipe, NULL, argument}
#define COL(heading, key, argument, digits) {heading, key, argument, digits, 0, ""}
#define OPT(heading, key, argument, digits) {heading, key, argument, digits, 1, ""}
#define FEW(trajectories) {trajectories, "E_q", "", 2, 0, trajectories}
#define TABLE(title, rows, columns) {title, rows, COUNT(rows), columns, COUNT(columns)}

static struct stat look_up(const struct row *r, const struct column *c)
{
    const struct stat none = {0, 0, 0, 0, 0, 0};
    char recipe[64];
    recipe_few(recipe, sizeof recipe, r->recipe, c->few);
    if (r->key && strcmp(c->key, "E_q") != 0) return none;
    return stat_of(recipe, r->key ? r->key : c->key, r->argument ? r->argument : c->argument);
}

static void print_table(FILE *f, const struct table *t)
{
    char text[128];
    fprintf(f, "### %s\n\n", t->title);
    note(f, t->title);
    for (int i = -2; i < t->rows; i++) {
        fprintf(f, i == -2 ? "| |" : i == -1 ? "|---|" : "| %s |", i < 0 ? "" : t->row[i].label);
        for (int j = 0; j < t->columns; j++) {
            const struct column *c = &t->column[j];
            int any = !c->optional;
            for (int k = 0; k < t->rows && !any; k++)
                any = look_up(&t->row[k], c).count > 0;
            if (!any) continue;
            if (i == -2) fprintf(f, " %s |", c->heading);
            else if (i == -1) fprintf(f, "---|");
            else {
                const struct stat v = look_up(&t->row[i], c);
                fprintf(f, " %s |", cell(text, sizeof text, &v, c->digits));
            }
        }
        fprintf(f, "\n");
    }
    fprintf(f, "\n");
}

/* ---- what stands in them ---- */

static const struct column few_columns[] = {FEW("5"), FEW("10"), FEW("20"), FEW("40")};

#define PEND2_ROWS \
    ROW("exp, acc", "pend2-exp-acc"), ROW("exp, ode", "pend2-exp-ode"), \
    ROW("base, acc", "pend2-base-acc"), ROW("base, ode", "pend2-base-ode"), \
    ROW("gyro, acc", "pend2-gyro-acc"), ROW("gyro, ode", "pend2-gyro-ode"), \
    ROW("base + gyro, acc", "pend2-basegyro-acc"), ROW("base + gyro, ode", "pend2-basegyro-ode"), \
    ROW("Cholesky, acc", "pend2-chol-acc"), ROW("Cholesky, ode", "pend2-chol-ode")
static const struct row pend2_rows[] = {PEND2_ROWS};
static const struct row pend2_error_rows[] = {PEND2_ROWS, TRIVIAL("pend2-exp-acc")};
static const struct column pend2_errors[] = {
    COL("E_qdd", "E_qdd", "0", 2), COL("E_q 25 ms", "E_q", "25", 2), COL("1 s", "E_q", "1000", 2), COL("whole", "E_q", "whole", 2),
    COL("E_qd 25 ms", "E_qd", "25", 2), COL("whole", "E_qd", "whole", 2),
};
static const struct column pend2_terms[] = {
    COL("M", "error", "M", 2), COL("c", "error", "c", 2), COL("g", "error", "g", 2), COL("drift own", "drift", "own", 2),
    COL("drift true", "drift", "true", 2), COL("training, s", "seconds", "train", 2),
};
static const struct row pend2_few[] = {
    AT("exponential, 1 s", "pend2-few*-exp", "1000"), AT("Cholesky, 1 s", "pend2-few*-chol", "1000"),
    AT("unstructured, 1 s", "pend2-few*-mlp", "1000"),
    AT("exponential, whole", "pend2-few*-exp", "whole"), AT("Cholesky, whole", "pend2-few*-chol", "whole"),
    AT("unstructured, whole", "pend2-few*-mlp", "whole"),
};

#define PEND16_ROWS \
    ROW("RO-LNN, long", "pend16-long"), ROW("RO-LNN, long, acc alone", "pend16-longacc"), \
    ROW("RO-LNN, ode", "pend16-ode"), ROW("RO-LNN, acc", "pend16-acc"), \
    ROW("RO-LNN, acc, Cholesky", "pend16-chol"), ROW("RO-LNN, acc, sequential", "pend16-seq"), \
    ROW("RO-LNN, acc, chart of acc frozen", "pend16-frozen"), ROW("POD + LNN", "pend16-pod"), \
    ROW("LNN, n = 16", "pend16-full"), ROW("LNN, n = 16, Cholesky", "pend16-fullchol"), ROW("L-OpInf", "pend16-opinf"), \
    ROW("L-OpInf, affine", "pend16-opinfaffine"), ROW("autoencoder + MLP", "pend16-mlp")
static const struct row pend16_rows[] = {PEND16_ROWS};
static const struct row pend16_q_rows[] = {PEND16_ROWS, TRIVIAL("pend16-acc")};
static const struct column pend16_q[] = {
    COL("E_q 0 ms", "E_q", "0", 2), COL("25 ms", "E_q", "25", 2), COL("1 s", "E_q", "1000", 2),
    COL("whole", "E_q", "whole", 2),
};
static const struct column pend16_qd[] = {
    COL("E_qd 0 ms", "E_qd", "0", 2), COL("25 ms", "E_qd", "25", 2), COL("1 s", "E_qd", "1000", 2),
    COL("whole", "E_qd", "whole", 2),
};
static const struct column pend16_qdd[] = {
    COL("E_qdd 0 ms", "E_qdd", "0", 2), COL("25 ms", "E_qdd", "25", 2), COL("1 s", "E_qdd", "1000", 2),
    COL("whole", "E_qdd", "whole", 2),
};
static const struct column pend16_cost[] = {
    COL("drift own", "drift", "own", 2), COL("drift true", "drift", "true", 2), COL("training, s", "seconds", "train", 2),
    COL("ms per predicted second", "us", "step", 2), /* steps of 1 ms: us a step = ms per 1000 */
};
static const struct row pend16_chart[] = {
    ROW("RO-LNN, long", "pend16-long"), ROW("RO-LNN, long, acc alone", "pend16-longacc"),
    ROW("RO-LNN, ode", "pend16-ode"), ROW("RO-LNN, acc", "pend16-acc"),
    ROW("RO-LNN, acc, Cholesky", "pend16-chol"), ROW("RO-LNN, acc, sequential", "pend16-seq"),
    ROW("RO-LNN, acc, chart of acc frozen", "pend16-frozen"), ROW("POD + LNN", "pend16-pod"),
    ROW("RO-LNN, acc, forces known (absolute)", "pend16-pd"),
};
static const struct column pend16_terms[] = {COL("M", "error", "M", 2), COL("V", "error", "V", 2)};
static const struct row pend16_few[] = {
    AT("RO-LNN, 25 ms", "pend16-few*-ro", "25"), AT("LNN, n = 16, 25 ms", "pend16-few*-full", "25"),
    AT("autoencoder + MLP, 25 ms", "pend16-few*-mlp", "25"),
    AT("RO-LNN, 1 s", "pend16-few*-ro", "1000"), AT("LNN, n = 16, 1 s", "pend16-few*-full", "1000"),
    AT("autoencoder + MLP, 1 s", "pend16-few*-mlp", "1000"),
    AT("RO-LNN, whole", "pend16-few*-ro", "whole"), AT("LNN, n = 16, whole", "pend16-few*-full", "whole"),
    AT("autoencoder + MLP, whole", "pend16-few*-mlp", "whole"),
};

#define ROPE_ROWS ROW("n = 4", "rope-n4"), ROW("n = 6", "rope-n6"), ROW("n = 10", "rope-n10"), ROW("n = 14", "rope-n14")
#define CLOTH_ROWS \
    ROW("n = 4", "cloth-n4"), ROW("n = 6", "cloth-n6"), ROW("n = 10", "cloth-n10"), ROW("n = 14", "cloth-n14"), \
    ROW("n = 10, no forces given", "cloth-free-n10")
static const struct row rope_rows[] = {ROPE_ROWS}, rope_q_rows[] = {
    ROPE_ROWS, ROW("L-OpInf, n = 10", "rope-opinf"), ROW("L-OpInf, affine, n = 10", "rope-opinfaffine"), TRIVIAL("rope-n10"),
    ROW("polynomial of the start", "rope-fit"),
};
static const struct row cloth_rows[] = {CLOTH_ROWS}, cloth_q_rows[] = {
    CLOTH_ROWS, ROW("L-OpInf, n = 10", "cloth-opinf"), ROW("L-OpInf, affine, n = 10", "cloth-opinfaffine"), TRIVIAL("cloth-n10"),
    ROW("polynomial of the start", "cloth-fit"),
};
static const struct column grid_columns[] = {
    COL("E_q 0 ms", "E_q", "0", 2), OPT("1 ms", "E_q", "1", 2), OPT("2 ms", "E_q", "2", 2), OPT("3 ms", "E_q", "3", 2),
    OPT("5 ms", "E_q", "5", 2), COL("25 ms", "E_q", "25", 2), OPT("100 ms", "E_q", "100", 2),
    OPT("250 ms", "E_q", "250", 2), OPT("500 ms", "E_q", "500", 2), COL("whole", "E_q", "whole", 2),
};
static const struct column grid_more[] = {
    COL("E_qdd", "E_qdd", "0", 2), COL("E_qd 0 ms", "E_qd", "0", 2), OPT("2 ms", "E_qd", "2", 2), OPT("3 ms", "E_qd", "3", 2),
    COL("25 ms", "E_qd", "25", 2), COL("whole", "E_qd", "whole", 2), COL("drift own", "drift", "own", 2),
    COL("drift true", "drift", "true", 2), COL("trajectories", "trajectories", "train", 1),
    COL("training, s", "seconds", "train", 2),
};

#define LATENT_ROWS \
    ROW("RO-LNN, acc", "pend16-acc"), ROW("RO-LNN, acc, chart of acc frozen", "pend16-frozen"), \
    ROW("dissipative SymODEN", "pend16-symoden"), ROW("HNN", "pend16-hnn"), \
    ROW("dissipative HNN", "pend16-dhnn"), ROW("COMET", "pend16-comet"), ROW("MLP, no structure", "pend16-mlp")
static const struct row structure_rows[] = {ROW("RO-LNN, ode", "pend16-ode"), LATENT_ROWS}, latent_rows[] = {LATENT_ROWS};
static const struct column within_range[] = {
    COL("E_q 0 ms", "E_q", "0", 2), COL("25 ms", "E_q", "25", 2), COL("400 ms", "E_q", "400", 2), COL("2 s", "E_q", "2000", 2),
    COL("whole", "E_q", "whole", 2), COL("drift true", "drift", "true", 2), COL("failed, 2 s", "failed", "2000", 2),
    COL("failed, whole", "failed", "whole", 2),
};
static const struct row narrow_rows[] = {
    ROW("RO-LNN, acc", "pend16-narrow-ro"), ROW("dissipative SymODEN", "pend16-narrow-symoden"), ROW("HNN", "pend16-narrow-hnn"),
    ROW("dissipative HNN", "pend16-narrow-dhnn"), ROW("COMET", "pend16-narrow-comet"),
    ROW("MLP, no structure", "pend16-narrow-mlp"),
};
static const struct row structure_few[] = {
    AT("RO-LNN, acc, 1 s", "pend16-few*-ro", "1000"), AT("MLP, no structure, 1 s", "pend16-few*-mlp", "1000"),
};
static const struct column latent_columns[] = {
    COL("E_qdd", "E_qdd", "0", 2), COL("E_q 25 ms", "E_q", "25", 2), COL("100 ms", "E_q", "100", 2), COL("1 s", "E_q", "1000", 2),
    COL("whole", "E_q", "whole", 2), COL("E_qd 25 ms", "E_qd", "25", 2),
};
static const struct column latent_cost[] = {
    COL("drift own", "drift", "own", 2), COL("drift true", "drift", "true", 2), COL("parameters", "parameters", "all", 1),
    COL("training, s", "seconds", "train", 2), COL("ms per predicted second", "us", "step", 2),
};

static const struct table
    pend2_error_table = TABLE("pend2: errors", pend2_error_rows, pend2_errors),
    pend2_term_table = TABLE("pend2: mechanics and cost", pend2_rows, pend2_terms),
    pend2_few_table = TABLE("pend2: few trajectories", pend2_few, few_columns),
    pend16_q_table = TABLE("pend16: errors of q", pend16_q_rows, pend16_q),
    pend16_qd_table = TABLE("pend16: errors of qd", pend16_rows, pend16_qd),
    pend16_qdd_table = TABLE("pend16: errors of qdd", pend16_rows, pend16_qdd),
    pend16_cost_table = TABLE("pend16: energy and cost", pend16_rows, pend16_cost),
    pend16_term_table = TABLE("pend16: mechanics through the learned chart", pend16_chart, pend16_terms),
    pend16_few_table = TABLE("pend16: few trajectories", pend16_few, few_columns),
    rope_table = TABLE("rope: errors of q", rope_q_rows, grid_columns),
    rope_more_table = TABLE("rope: accelerations, velocities, energy", rope_rows, grid_more),
    cloth_table = TABLE("cloth: errors of q", cloth_q_rows, grid_columns),
    cloth_more_table = TABLE("cloth: accelerations, velocities, energy", cloth_rows, grid_more),
    within_table = TABLE("pend16: within the training range", structure_rows, within_range),
    narrow_table = TABLE("pend16: out of the training range", narrow_rows, within_range),
    structure_few_table = TABLE("pend16: structure and few trajectories", structure_few, few_columns),
    latent_table = TABLE("pend16: one autoencoder, six models of its motion", latent_rows, latent_columns),
    latent_cost_table = TABLE("pend16: their energy and cost", latent_rows, latent_cost);

static const struct series pend2_curves[] = {
    {"exponential", "pend2-few*-exp", "#08519c", ""}, {"Cholesky", "pend2-few*-chol", "#e6550d", ""},
    {"unstructured", "pend2-few*-mlp", "#555", "5 3"},
};
static const struct series pend16_few_curves[] = {
    {"RO-LNN", "pend16-few*-ro", "#08519c", ""}, {"LNN, n = 16", "pend16-few*-full", "#238b45", ""},
    {"autoenc. + MLP", "pend16-few*-mlp", "#555", "5 3"},
};
static const struct series pend16_curves[] = {
    {"RO-LNN, long", "pend16-long", "#08306b", ""}, {"RO-LNN, ode", "pend16-ode", "#2171b5", ""},
    {"RO-LNN, acc", "pend16-acc", "#6baed6", ""}, {"RO, Cholesky", "pend16-chol", "#807dba", ""},
    {"POD + LNN", "pend16-pod", "#a63603", ""}, {"LNN, n = 16", "pend16-full", "#006d2c", ""},
    {"same, Cholesky", "pend16-fullchol", "#74c476", ""}, {"L-OpInf", "pend16-opinf", "#e6550d", "7 3"},
    {"L-OpInf, affine", "pend16-opinfaffine", "#e6ab02", "7 3"}, {"autoenc. + MLP", "pend16-mlp", "#555", "5 3"},
};
static const struct series structure_curves[] = {
    {"RO-LNN, acc", "pend16-acc", "#6baed6", ""}, {"RO-LNN, ode", "pend16-ode", "#08519c", ""},
    {"diss. SymODEN", "pend16-symoden", "#238b45", ""}, {"HNN", "pend16-hnn", "#e6550d", ""},
    {"diss. HNN", "pend16-dhnn", "#e6ab02", ""}, {"COMET", "pend16-comet", "#7a0177", ""}, {"MLP", "pend16-mlp", "#555", "5 3"},
};
static const struct series narrow_curves[] = {
    {"RO-LNN, acc", "pend16-narrow-ro", "#6baed6", ""}, {"diss. SymODEN", "pend16-narrow-symoden", "#238b45", ""},
    {"HNN", "pend16-narrow-hnn", "#e6550d", ""}, {"diss. HNN", "pend16-narrow-dhnn", "#e6ab02", ""},
    {"COMET", "pend16-narrow-comet", "#7a0177", ""}, {"MLP", "pend16-narrow-mlp", "#555", "5 3"},
};
static const struct panel pend2_few_panels[] = {
    {"E_q after 1 s, %", "E_q", "1000", pend2_curves, COUNT(pend2_curves)},
    {"E_q of the whole 3 s, %", "E_q", "whole", pend2_curves, COUNT(pend2_curves)},
};
static const struct panel pend16_few_panels[] = {
    {"E_q after 25 ms, %", "E_q", "25", pend16_few_curves, COUNT(pend16_few_curves)},
    {"E_q after 1 s, %", "E_q", "1000", pend16_few_curves, COUNT(pend16_few_curves)},
};
static const struct panel pend16_panels[] = {{"E_q, %", "E_q", NULL, pend16_curves, COUNT(pend16_curves)}};
static const struct panel structure_panels[] = {
    {"E_q, %, within the training range", "E_q", NULL, structure_curves, COUNT(structure_curves)},
    {"E_q, %, out of it", "E_q", NULL, narrow_curves, COUNT(narrow_curves)},
};

/* ---- goals ---- */

enum { AT_MOST, AT_LEAST, BELOW, COMPARED };

/* AT_MOST, AT_LEAST a limit; BELOW: at least `limit` times below the least of the others, where other_key stands for key if it
   is set; COMPARED: the quotient is shown. */
struct goal {
    const char *text, *recipe, *key, *argument;
    int kind;
    double limit;
    const char *other[3], *other_key;
};

#define MOST(text, recipe, key, argument, limit) {text, recipe, key, argument, AT_MOST, limit, {NULL, NULL, NULL}, NULL}
#define FASTER(text, system, times) \
    {text, "speed", system, "**faster**, MuJoCo at its standard step, the model at its largest stable one: latent", AT_LEAST, \
     times, {NULL, NULL, NULL}, NULL}
#define TRIVIAL_BELOW(text, recipe, ms, limit) {text, recipe, "E_q", ms, BELOW, limit, {recipe, NULL, NULL}, "trivial"}
#define TIMES_BELOW(text, recipe, argument, limit, ...) {text, recipe, "E_q", argument, BELOW, limit, {__VA_ARGS__}, NULL}
#define L_OPINF "pend16-opinf", "pend16-opinfaffine"
#define BETTER(text, recipe, key, argument, than) {text, recipe, key, argument, BELOW, 1, {than, NULL, NULL}, NULL}
#define FULL(text, recipe, argument, full) {text, recipe, "E_q", argument, COMPARED, 0, {full, NULL, NULL}, NULL}

static const struct goal goals[] = {
    MOST("pend16: E_q 25 ms of the multi-step RO-LNN at most 0.5 %", "pend16-long", "E_q", "25", .5),
    MOST("the same, equal budget", "pend16-ode", "E_q", "25", .5),
    TIMES_BELOW("40 times below POD + LNN and both L-OpInf", "pend16-long", "25", 40, "pend16-pod", L_OPINF),
    TIMES_BELOW("the same, equal budget", "pend16-ode", "25", 40, "pend16-pod", L_OPINF),
    TRIVIAL_BELOW("8 times below q + h qd", "pend16-long", "25", 8),
    TRIVIAL_BELOW("the same, equal budget", "pend16-ode", "25", 8),
    TIMES_BELOW("at 1 s 10 times below the linear models, both L-OpInf", "pend16-long", "1000", 10, L_OPINF),
    TIMES_BELOW("the same, equal budget", "pend16-ode", "1000", 10, L_OPINF),
    TIMES_BELOW("at 1 s 10 times below POD + LNN, a linear chart with learned dynamics", "pend16-long", "1000", 10, "pend16-pod"),
    TIMES_BELOW("the same, equal budget", "pend16-ode", "1000", 10, "pend16-pod"),
    TIMES_BELOW("over 3 s 10 times below the linear models, both L-OpInf", "pend16-long", "whole", 10, L_OPINF),
    TIMES_BELOW("the same, equal budget", "pend16-ode", "whole", 10, L_OPINF),
    TIMES_BELOW("over 3 s 10 times below POD + LNN", "pend16-long", "whole", 10, "pend16-pod"),
    TIMES_BELOW("the same, equal budget", "pend16-ode", "whole", 10, "pend16-pod"),
    FULL("full-order LNN compared at 25 ms", "pend16-acc", "25", "pend16-full"),
    FULL("at 1 s", "pend16-acc", "1000", "pend16-full"),
    FULL("over 3 s", "pend16-acc", "whole", "pend16-full"),
    FULL("at 25 ms, 5 trajectories", "pend16-few5-ro", "25", "pend16-few5-full"),
    FULL("at 25 ms, 10 trajectories", "pend16-few10-ro", "25", "pend16-few10-full"),
    FULL("at 25 ms, 20 trajectories", "pend16-few20-ro", "25", "pend16-few20-full"),
    FULL("at 25 ms, 40 trajectories", "pend16-few40-ro", "25", "pend16-few40-full"),
    MOST("rope, n = 10: E_q 25 ms at most 0.3 %", "rope-n10", "E_q", "25", .3),
    MOST("rope, n = 10: whole 1 s at most 3 %", "rope-n10", "E_q", "whole", 3),
    MOST("cloth, n = 10: reconstruction at most 1 %", "cloth-n10", "E_q", "0", 1),
    MOST("cloth, n = 10: whole 0.25 s with forces at most 1.5 %", "cloth-n10", "E_q", "whole", 1.5),
    MOST("cloth, n = 10: whole 0.25 s without given forces at most 4 %", "cloth-free-n10", "E_q", "whole", 4),
    FASTER("pend16: 10 times faster than mj_step, latent", "pend16", 10),
    FASTER("rope: 50 times faster than mj_step, latent", "rope", 50),
    FASTER("cloth: 50 times faster than mj_step, latent", "cloth", 50),
    FASTER("the same, contact forces given", "cloth, contact forces given", 50),
    BETTER("joint training better than sequential, 25 ms", "pend16-acc", "E_q", "25", "pend16-seq"),
    BETTER("joint training better than sequential, 1 s", "pend16-acc", "E_q", "1000", "pend16-seq"),
    BETTER("exponential map better than Cholesky in M, pend2, acc", "pend2-exp-acc", "error", "M", "pend2-chol-acc"),
    BETTER("exponential map better than Cholesky in M, pend2, ode", "pend2-exp-ode", "error", "M", "pend2-chol-ode"),
    BETTER("exponential map better than Cholesky in M, pend16", "pend16-acc", "error", "M", "pend16-chol"),
};

static const char *verdict(int known, int met)
{
    return !known ? "-" : met ? "met" : "**missed**";
}

/* Its name, seeds if some are missing, trajectories. */
static void print_runs(FILE *f, const char *recipe)
{
    const struct recipe *e = recipe_of(recipe);
    const struct group *g = group_of(recipe);
    const struct stat trained = stat_of(recipe, "trajectories", "train");
    fprintf(f, "%s", strcmp(recipe, "speed") == 0 ? "section 5" : recipe);
    if (e && g->count > 0 && g->count < e->seeds) fprintf(f, ", %d of %d seeds", g->count, e->seeds);
    if (trained.count > 0) fprintf(f, ", %.0f trajectories", trained.mean);
}

static void print_goal(FILE *f, const struct goal *g)
{
    char mine[128], theirs[128], times[32];
    const struct stat v = stat_of(g->recipe, g->key, g->argument);
    struct stat least = {0, 0, 0, 0, 0, 0};
    const char *who = "";
    int all = 1, met = g->kind == AT_MOST ? v.mean <= g->limit : v.mean >= g->limit;
    for (int i = 0; i < 3 && g->other[i]; i++) {
        const struct stat o = stat_of(g->other[i], g->other_key ? g->other_key : g->key, g->argument);
        all = all && o.count > 0;
        if (o.count > 0 && (least.count == 0 || o.mean < least.mean)) least = o, who = g->other_key ? "q + h qd" : g->other[i];
    }
    fprintf(f, "| %s | ", g->text);
    print_runs(f, g->recipe);
    fprintf(f, " | %s", cell(mine, sizeof mine, &v, 2));
    if (g->kind == AT_LEAST && v.count > 0) fprintf(f, " times");
    if (least.count > 0) {
        fprintf(f, ", %s %s", who, cell(theirs, sizeof theirs, &least, 2));
        if (v.count > 0) fprintf(f, ": %s times", number(times, sizeof times, least.mean / v.mean, 2));
        met = least.mean / v.mean >= g->limit && least.median / v.median >= g->limit;
    }
    fprintf(f, " | %s |\n", verdict(all && v.count > 0 && g->kind != COMPARED, met));
}

/* ---- the run list ---- */

struct cost {
    double hours, longest; /* of all runs, minutes of one */
    int runs, missing;
};

static struct cost cost(void)
{
    struct cost c = {0, 0, 0, 0};
    for (int i = 0; i < recipes_count; i++) {
        const struct group *g = group_of(recipes[i].name);
        const struct stat s = stat_of(recipes[i].name, "seconds", "all");
        c.runs += g->count, c.missing += g->count < recipes[i].seeds ? recipes[i].seeds - g->count : 0;
        c.hours += s.count * s.mean / 3600;
        if (s.count > 0) c.longest = fmax(c.longest, s.most / 60);
    }
    return c;
}

static void print_missing(FILE *f)
{
    int any = 0;
    for (int i = 0; i < recipes_count; i++) {
        const struct group *g = group_of(recipes[i].name);
        int named = 0;
        for (int seed = 1, k = 0; seed <= recipes[i].seeds; seed++) {
            if (k < g->count && g->seed[k] == seed) {
                k++;
                continue;
            }
            if (!named) fprintf(f, "%s%s", any ? ", " : "Missing: ", recipes[i].name);
            if (g->count > 0) fprintf(f, "%s%d", named ? " " : "-", seed);
            any = named = 1;
        }
    }
    fprintf(f, any ? ".\n\n" : "No run is missing.\n\n");
}

static void print_runs_table(FILE *f)
{
    static const char *const system[TRUTH_SYSTEMS] = {
        [TRUTH_PEND2] = "pend2", [TRUTH_PEND2_ACT] = "pend2, torques", [TRUTH_PEND16] = "pend16",
        [TRUTH_PEND16_PD] = "pend16, PD torques",
        [TRUTH_PEND16_NARROW] = "pend16, starts of .3 rad", [TRUTH_ROPE] = "rope", [TRUTH_CLOTH] = "cloth",
    };
    static const struct { const char *key, *argument; int digits; } column[] = {
        {"parameters", "all", 1}, {"samples", "million", 3}, {"seconds", "train", 3}, {"seconds", "all", 3},
    };
    char text[32];
    const struct cost c = cost();
    fprintf(f, "| run | system | trajectories | seeds | parameters | million samples | training, s | with its measurement, s |\n"
               "|---|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < recipes_count; i++) {
        const struct recipe *e = &recipes[i];
        const int seeds = group_of(e->name)->count;
        const struct stat trained = stat_of(e->name, "trajectories", "train");
        fprintf(f, "| %s | %s | %.0f | ", e->name, system[e->system] ? system[e->system] : "",
                trained.count ? trained.mean : e->train);
        fprintf(f, seeds < e->seeds ? "%d of %d |" : "%d |", seeds, e->seeds);
        for (int j = 0; j < COUNT(column); j++) {
            const struct stat v = stat_of(e->name, column[j].key, column[j].argument);
            fprintf(f, " %s |", v.count ? number(text, sizeof text, v.mean, column[j].digits) : "-");
        }
        fprintf(f, "\n");
    }
    fprintf(f, "\n%d of %d runs: %.2f core-hours; the longest run took %.0f minutes.\n\n", c.runs, c.runs + c.missing,
            c.hours, c.longest);
    print_missing(f);
}

/* ---- the document ---- */

static void machine(char *s, size_t size)
{
    char line[256];
    FILE *f = fopen("/proc/cpuinfo", "r");
    snprintf(s, size, "an unknown processor");
    while (f && fgets(line, sizeof line, f))
        if (strncmp(line, "model name", 10) == 0 && strchr(line, ':')) {
            line[strcspn(line, "\n")] = 0;
            snprintf(s, size, "%s", strchr(line, ':') + 2);
            break;
        }
    if (f) fclose(f);
}

static void print_head(FILE *f)
{
    char cpu[256];
    machine(cpu, sizeof cpu);
    fprintf(f, "# Experiments\n\n"
        "The experiments of the paper and more, on motion simulated by MuJoCo 2.2. `make experiments` repeats every run that has "
        "no result yet and writes this file and its pictures. Machine: %s, one core per run, float, gcc -O3 -march=native.\n\n",
        cpu);
    note(f, "Experiments");
    fprintf(f,
        "Cells: mean ± standard deviation (median) over the seeds; one number: one seed, or all the same; `-`: no run. Errors and "
        "drift in per cent, on ten trajectories that the training has not seen. A goal is met if mean and median meet it. Settings "
        "(rates, weights, lengths) were chosen in trials that looked at the errors on these ten trajectories, too: there is "
        "no third set.\n\n"
        "- E_q, E_qd, E_qdd at h: sqrt(mean |q_pred - q|^2 / mean |q - qbar|^2) at the end of windows of h ms that start every 25 ms "
        "(every 100 ms where h > 100); qd, qdd the same, not centred. 0 ms: reconstruction. The model sees `q`, `qd` once, at the "
        "start; qbar: mean over all recordings simulated for training. E_qdd is against central differences of qd, without the ends "
        "of a trajectory.\n"
        "- whole: one roll-out per trajectory (pendulums 3 s, rope 1 s, cloth 0.25 s), mean over all its samples.\n"
        "- q + h qd: the trivial predictor, windows every 25 ms at every h. polynomial of the start: no model; every sample a quadratic "
        "polynomial, fitted to the training trajectories, of the start's two leading POD coordinates.\n"
        "- drift own: largest |E - E(0) - work| of the model's own energy over its largest kinetic energy, along whole roll-outs; "
        "drift true: the same of MuJoCo's energy of the predicted motion.\n"
        "- failed: windows in which the roll-out ended with a status; the last good state then counts; of whole trajectories, the "
        "samples after that.\n"
        "- M, c, g, V: relative error of mass matrix, velocity forces, gravity, potential against MuJoCo's (pend16: through the "
        "learned chart, up to one factor unless forces are known).\n"
        "- million samples: of which gradients were taken; these and the time of training with those of the run it goes on from; "
        "parameters without a POD basis.\n"
        "- acc: trained with the acceleration loss; ode: then with the ODE loss over windows of 40 ms; longacc, "
        "long: more recordings, wider networks, more samples, and for long windows of 250 ms, 1, 2 and 3 s.\n\n");
}

static void print_file(FILE *f, const char *name)
{
    char path[512];
    int c;
    snprintf(path, sizeof path, "%s/%s", result_dir, name);
    FILE *in = fopen(path, "r");
    if (!in) return;
    while ((c = getc(in)) != EOF)
        putc(c, f);
    fclose(in);
    fprintf(f, "\n");
}

static char *in_dir(const char *dir, const char *name)
{
    static char path[512];
    snprintf(path, sizeof path, "%s/%s", dir, name);
    return path;
}

static void print_goals(FILE *f)
{
    const struct cost c = cost();
    fprintf(f, "| goal | run | reached | |\n|---|---|---|---|\n");
    for (int i = 0; i < COUNT(goals); i++)
        print_goal(f, &goals[i]);
    const int all = c.runs + c.missing;
    fprintf(f, "| no run over 60 minutes | %d of %d | %.0f minutes | %s |\n", c.runs, all, c.longest,
            verdict(c.runs > 0, c.longest <= 60));
    fprintf(f, "| at most 20 core-hours | %d of %d | %.2f | %s |\n\n", c.runs, all, c.hours, verdict(c.runs > 0, c.hours <= 20));
}

static void print_all(FILE *f, const char *dir)
{
    print_head(f);
    section(f, "Runs");
    print_runs_table(f);

    section(f, "1. Two joints");
    fprintf(f, "pend2 under a sine torque on each joint, in training and in test. exp: exponential map at I; base: at a learned P; "
               "gyro: an SPD layer behind it; Cholesky: DeLaN.\n\n");
    print_table(f, &pend2_error_table);
    print_table(f, &pend2_term_table);
    print_table(f, &pend2_few_table);
    picture(f, picture_curves(in_dir(dir, "pend2_few.svg"), "2 joints: error and number of training trajectories", pend2_few_panels,
                              COUNT(pend2_few_panels), 330),
            "error of q after 1 s and over 3 s against the number of training trajectories", "pend2_few.svg");

    section(f, "2. Sixteen joints");
    print_table(f, &pend16_q_table);
    print_table(f, &pend16_qd_table);
    print_table(f, &pend16_qdd_table);
    print_table(f, &pend16_cost_table);
    print_table(f, &pend16_term_table);
    picture(f, picture_curves(in_dir(dir, "pend16.svg"), "16 joints, n = 4: error of q against the horizon", pend16_panels,
                              COUNT(pend16_panels), 470),
            "error of q of ten models against the horizon", "pend16.svg");
    print_table(f, &pend16_few_table);
    picture(f, picture_curves(in_dir(dir, "pend16_few.svg"), "16 joints: error and number of training trajectories",
                              pend16_few_panels, COUNT(pend16_few_panels), 330),
            "error of q after 25 ms and 1 s against the number of training trajectories", "pend16_few.svg");

    section(f, "3. Rope and cloth");
    print_table(f, &rope_table);
    print_table(f, &rope_more_table);
    picture(f, picture_rope(in_dir(dir, "rope.svg"), "Rope, 192 dof, n = 10: one unseen second", "rope-n10-1"),
            "true and predicted rope at five instants", "rope.svg");
    print_table(f, &cloth_table);
    print_table(f, &cloth_more_table);
    picture(f, picture_cloth(in_dir(dir, "cloth.svg"), "Cloth, 600 dof, n = 10: an unseen fall", "cloth-n10-1"),
            "true and predicted cloth at five instants", "cloth.svg");
    picture(f, picture_cloth(in_dir(dir, "cloth_free.svg"), "Cloth, 600 dof, n = 10, no contact forces given", "cloth-free-n10-1"),
            "true and predicted cloth at five instants, no contact forces given", "cloth_free.svg");

    section(f, "4. Structure");
    fprintf(f, "The ODE loss looks 40 ms ahead: 400 ms and 2 s are 10 and 50 times as far. Out of the training range: trained on "
               "starts of up to .3 rad, tested from up to .5.\n\n");
    print_table(f, &within_table);
    print_table(f, &narrow_table);
    picture(f, picture_curves(in_dir(dir, "structure.svg"), "16 joints: with and without structure", structure_panels,
                              COUNT(structure_panels), 380),
            "error of q against the horizon, within the training range and out of it", "structure.svg");
    print_table(f, &structure_few_table);

    section(f, "5. Speed");
    print_file(f, "speed.md");

    section(f, "6. Hamiltonian relatives");
    fprintf(f, "In the latent space of the autoencoder of RO-LNN, acc, of the same seed, which stays as it is: it was trained together "
               "with the networks of RO-LNN; `chart of acc frozen` is RO-LNN under the same condition. Samples and time of training are "
               "without those of the autoencoder. HNN and its dissipative form take zd for the momentum, as no other is measured.\n\n");
    print_table(f, &latent_table);
    print_table(f, &latent_cost_table);

    section(f, "Goals");
    print_goals(f);
}

int main(int argc, char **argv)
{
    if (argc != 3) return fprintf(stderr, "usage: report DIR OUTDIR\n"), 2;
    result_dir = argv[1];
    notes_read(in_dir(argv[2], "notes.md"));
    FILE *f = fopen(in_dir(argv[2], "RESULTS.md"), "w");
    if (!f) return perror(in_dir(argv[2], "RESULTS.md")), 1;
    print_all(f, argv[2]);
    notes_left();
    const int bad = ferror(f);
    if (fclose(f) != 0 || bad) return perror("RESULTS.md"), 1;
    return 0;
}
