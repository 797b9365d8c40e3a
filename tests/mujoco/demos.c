/* SPDX-License-Identifier: MIT */
#include "demos.h"

#include <ctype.h>
#include <errno.h>
#include <float.h>
#include <limits.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <hdf5.h>

int demos_wide(const demos *d) { return 1 + 2 * d->N + d->forces; }

int demos_add(demos *d, int samples, int test, const double *row)
{
    const size_t bytes = (size_t)samples * (size_t)demos_wide(d) * sizeof *row;
    demo *more = realloc(d->demo, (size_t)(d->count + 1) * sizeof *more);
    if (more) d->demo = more;
    if (!more || !(more[d->count].row = malloc(bytes ? bytes : 1))) {
        fprintf(stderr, "out of memory\n");
        return -1;
    }
    memcpy(more[d->count].row, row, bytes);
    more[d->count].samples = samples, more[d->count].test = test;
    d->count++;
    return 0;
}

void demos_free(demos *d)
{
    for (int k = 0; k < d->count; k++) free(d->demo[k].row);
    free(d->demo);
    memset(d, 0, sizeof *d);
}

/* ---- CSV ---- */

static void header(FILE *f, const char *name, int n)
{
    for (int i = 1; i <= n; i++) fprintf(f, ",%s%d", name, i);
}

/* As few digits from 9 on as tell x to a rounding, without an exponent if they do: stamps since 1970 need 17. */
static void put_time(FILE *f, double x)
{
    char text[40];
    for (int digits = 9; digits <= 17; digits++) {
        snprintf(text, sizeof text, "%.*g", digits, x);
        if (fabs(strtod(text, NULL) - x) <= DBL_EPSILON * fabs(x) && (fabs(x) < 1 || !strchr(text, 'e'))) break;
    }
    fputs(text, f);
}

/* What a file is called until it is whole; NULL: a name that is too long. */
static const char *part_of(const char *path)
{
    static char part[4096];
    return snprintf(part, sizeof part, "%s.part", path) < (int)sizeof part ? part : NULL;
}

void demos_forget(const char *path)
{
    if (part_of(path)) remove(part_of(path));
}

int demos_write_csv(const demos *d, int test, const char *path)
{
    const size_t wide = (size_t)demos_wide(d);
    const char *const part = part_of(path);
    FILE *f = part ? fopen(part, "w") : NULL;
    if (!f) {
        perror(path);
        return -1;
    }
    fputs("t", f), header(f, "q", d->N), header(f, "qd", d->N), header(f, d->inputs ? "u" : "tau", d->forces);
    fputc('\n', f);
    for (int k = 0, written = 0; k < d->count; k++) {
        if (d->demo[k].test != test) continue;
        if (written++) fputc('\n', f);
        for (int i = 0; i < d->demo[k].samples; i++) {
            const double *row = d->demo[k].row + (size_t)i * wide;
            put_time(f, row[0]);
            for (size_t j = 1; j < wide; j++) fprintf(f, ",%.9g", row[j]);
            fputc('\n', f);
        }
    }
    const int bad = ferror(f);
    if (!fclose(f) && !bad && !rename(part, path)) return 0;
    perror(path), remove(part);
    return -1;
}

/* A row of numbers apart by commas: 0, or -1 if it has more or fewer. */
static int get_row(const char *at, int wide, double *row)
{
    for (int j = 0; j < wide; j++) {
        char *end;
        row[j] = strtod(at, &end);
        if (end == at || (j + 1 < wide ? *end != ',' : *end && !strchr("\r\n", *end))) return -1;
        at = end + 1;
    }
    return 0;
}

int demos_read_csv(demos *d, const char *path)
{
    static char line[1 << 16];
    FILE *f = fopen(path, "r");
    double *row = NULL;
    int samples = 0, number = 1, bad, more;
    if (!f || !fgets(line, sizeof line, f)) {
        fprintf(stderr, "%s: %s\nhint: check the path\n", path, f ? "an empty file" : strerror(errno));
        if (f) fclose(f);
        return -1;
    }
    d->forces = -2 * d->N;
    for (const char *c = line; *c; c++) d->forces += *c == ',';
    const int wide = demos_wide(d);
    bad = d->forces < 0;
    for (more = !bad; more && !bad;) {
        more = fgets(line, sizeof line, f) != NULL, number++;
        if (more && strspn(line, " \r\n") < strlen(line)) {
            double *longer = realloc(row, (size_t)(samples + 1) * (size_t)wide * sizeof *row);
            row = longer ? longer : row;
            bad = !longer || get_row(line, wide, row + (size_t)samples++ * (size_t)wide);
        } else if (samples > 0) {
            bad = demos_add(d, samples, 0, row), samples = 0;
        }
    }
    if (bad)
        fprintf(stderr, "%s:%d: no recording of %d joints\nhint: columns t, q, qd and tau, apart by commas\n", path, number, d->N);
    free(row), fclose(f);
    return bad ? -1 : 0;
}

/* ---- HDF5: writing ---- */

/* Columns from .. from + n - 1 of a recording; rank 1: one column. */
static int put_columns(hid_t group, const char *name, const demos *d, const demo *r, int from, int n, int rank)
{
    const hsize_t shape[2] = {(hsize_t)r->samples, (hsize_t)n};
    const int wide = demos_wide(d);
    double *x = malloc((size_t)r->samples * (size_t)n * sizeof *x);
    if (!x) return -1;
    for (int i = 0; i < r->samples * n; i++) x[i] = r->row[i / n * wide + from + i % n];
    hid_t space = H5Screate_simple(rank, shape, NULL), plist = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_obj_track_times(plist, 0);      /* the same bytes from run to run */
    hid_t set = H5Dcreate2(group, name, H5T_IEEE_F64LE, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    const herr_t bad = set < 0 || H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) < 0;
    if (set >= 0) H5Dclose(set);
    H5Pclose(plist), H5Sclose(space);
    free(x);
    return bad ? -1 : 0;
}

static int put_demo(hid_t data, const demos *d, int k)
{
    char name[32];
    snprintf(name, sizeof name, "demo_%d", k);
    hid_t group = H5Gcreate2(data, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (group < 0) return -1;
    const demo *r = &d->demo[k];
    const int bad = put_columns(group, "t", d, r, 0, 1, 1) || put_columns(group, "q", d, r, 1, d->N, 2)
        || put_columns(group, "qd", d, r, 1 + d->N, d->N, 2)
        || (d->forces && put_columns(group, d->inputs ? "u" : "tau", d, r, 1 + 2 * d->N, d->forces, 2));
    H5Gclose(group);
    return bad;
}

static int put_string(hid_t group, const char *name, const char *value)
{
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate(H5S_SCALAR);
    H5Tset_size(type, strlen(value) + 1);
    hid_t a = H5Acreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    const herr_t bad = a < 0 || H5Awrite(a, type, value) < 0;
    if (a >= 0) H5Aclose(a);
    H5Tclose(type), H5Sclose(space);
    return bad ? -1 : 0;
}

/* The names of those that are held out, or not. */
static int put_mask(hid_t group, const char *name, const demos *d, int test)
{
    enum { LETTERS = 16 };
    char *names = calloc((size_t)d->count, LETTERS);
    hsize_t n = 0;
    if (!names) return -1;
    for (int k = 0; k < d->count; k++)
        if (d->demo[k].test == test) snprintf(names + LETTERS * n++, LETTERS, "demo_%d", k);
    hid_t type = H5Tcopy(H5T_C_S1), space = H5Screate_simple(1, &n, NULL), plist = H5Pcreate(H5P_DATASET_CREATE);
    H5Tset_size(type, LETTERS);
    H5Pset_obj_track_times(plist, 0);
    hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    const herr_t bad = set < 0 || H5Dwrite(set, type, H5S_ALL, H5S_ALL, H5P_DEFAULT, names) < 0;
    if (set >= 0) H5Dclose(set);
    H5Pclose(plist), H5Sclose(space), H5Tclose(type);
    free(names);
    return bad ? -1 : 0;
}

int demos_write_h5(const demos *d, const char *model, const char *path)
{
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    if (file < 0) return -1;
    hid_t data = H5Gcreate2(file, "data", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), space = H5Screate(H5S_SCALAR);
    hid_t mask = H5Gcreate2(file, "mask", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    hid_t a = H5Acreate2(data, "dt", H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT);
    int bad = a < 0 || H5Awrite(a, H5T_NATIVE_DOUBLE, &d->dt) < 0 || put_string(data, "model", model);
    for (int k = 0; k < d->count && !bad; k++) bad = put_demo(data, d, k);
    bad = bad || put_mask(mask, "train", d, 0) || put_mask(mask, "test", d, 1);
    H5Aclose(a), H5Sclose(space), H5Gclose(mask), H5Gclose(data);
    return H5Fclose(file) < 0 || bad ? -1 : 0;
}

/* ---- HDF5: reading ---- */

/* Says what is wrong in a place, and what to do, without control characters of names in the file. Returns -1. */
static int refuse(const char *place, const char *hint, const char *format, ...)
{
    char text[1000];
    va_list list;
    int n = snprintf(text, sizeof text, "%s: ", place);
    if (n < 0 || n >= (int)sizeof text) n = (int)sizeof text - 1;
    va_start(list, format);
    vsnprintf(text + n, sizeof text - (size_t)n, format, list);
    va_end(list);
    for (char *p = text; *p; p++)
        if (iscntrl((unsigned char)*p)) *p = '?';
    fprintf(stderr, "%s\nhint: %s\n", text, hint);
    return -1;
}

/* A dataset of numbers, [count][S][n], [S][n] or [S]. */
typedef struct {
    int rank, count, samples, n;
    double *x;
} array;

/* The shape of a dataset into *a. Returns NULL, or what is wrong with it. */
static const char *get_shape(hid_t set, hid_t space, hid_t type, array *a)
{
    enum { PLAIN = 1 << 25, DENSE = 1100 }; /* numbers that are read unasked; deflate packs at most 1,032 bytes into one */
    hsize_t shape[3] = {1, 1, 1};
    double size = 1;
    a->rank = space < 0 ? 0 : H5Sget_simple_extent_ndims(space);
    if (a->rank < 1 || a->rank > 3 || type < 0 || (H5Tget_class(type) != H5T_FLOAT && H5Tget_class(type) != H5T_INTEGER))
        return "no array of numbers of rank 1 to 3";
    if (H5Sget_simple_extent_dims(space, shape + (a->rank == 3 ? 0 : 1), NULL) < 0) return "its shape cannot be read";
    for (int i = 0; i < 3; i++) size *= (double)shape[i];
    if (size < 1) return "no numbers";
    if (size > INT_MAX / 2 || (size > PLAIN && size * (double)H5Tget_size(type) > DENSE * (double)H5Dget_storage_size(set)))
        return "too many numbers, or more than the file holds";
    a->count = (int)shape[0], a->samples = (int)shape[1], a->n = (int)shape[2];
    return NULL;
}

static int get_array(const char *place, hid_t group, const char *name, array *a)
{
    hid_t set = H5Dopen2(group, name, H5P_DEFAULT), space = set < 0 ? -1 : H5Dget_space(set);
    hid_t type = set < 0 ? -1 : H5Dget_type(set);
    memset(a, 0, sizeof *a);
    const char *bad = get_shape(set, space, type, a);
    if (!bad) {
        a->x = malloc((size_t)a->count * (size_t)a->samples * (size_t)a->n * sizeof *a->x);
        if (!a->x) bad = "out of memory";
        else if (H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, a->x) < 0) bad = "its numbers cannot be read";
    }
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    if (set >= 0) H5Dclose(set);
    return bad ? refuse(place, "is it what q=, qd=, force=, t= should name, and the file whole?", "%s: %s", name, bad) : 0;
}

/* Nonzero if there is such a name, a path of several, too. */
static int there(hid_t group, const char *name)
{
    char path[256];
    if (strcmp(name, "/") == 0) return 1;
    for (const char *p = name; p; p = strchr(p + 1, '/')) {
        const char *end = strchr(p + 1, '/');
        snprintf(path, sizeof path, "%.*s", (int)(end ? end - name : (long)strlen(name)), name);
        if (H5Lexists(group, path, H5P_DEFAULT) <= 0) return 0;
    }
    return 1;
}

/* The name that is wanted, or the first of a list that is there; NULL: none is. */
static const char *choose(hid_t group, const char *want, const char *const *list)
{
    if (want) return there(group, want) ? want : NULL;
    while (*list && !there(group, *list)) list++;
    return *list;
}

/* Everything that a recording, or a set of equally long ones, consists of; x NULL: it is not there. */
enum { T, Q, QD, FORCE, PARTS };

/* t, q and qd of `states`, MuJoCo's state. */
static int get_states(const char *place, hid_t group, int N, array part[PARTS])
{
    array s;
    if (get_array(place, group, "states", &s)) return -1;
    if (s.rank != 2 || s.n < 1 + 2 * N) {
        free(s.x);
        return refuse(place, "states=N is right if nq = nv = N", "states has %d columns, t, q and qd of %d joints have %d", s.n, N,
                      1 + 2 * N);
    }
    for (int p = T; p <= QD; p++) {
        const int n = p == T ? 1 : N, from = p == T ? 0 : p == Q ? 1 : 1 + n;
        array a = {2, 1, s.samples, n, malloc((size_t)s.samples * (size_t)n * sizeof(double))};
        for (int i = 0; a.x && i < s.samples * n; i++) a.x[i] = s.x[i / n * s.n + from + i % n];
        part[p] = a;
    }
    free(s.x);
    return 0;
}

static int get_parts(const char *place, hid_t group, const layout *want, array part[PARTS], int *inputs)
{
    static const char *const names[PARTS][7] = {
        {"t", "time", "obs/t", "obs/time"}, {"q", "qpos", "obs/q", "obs/qpos", "obs/robot0_joint_pos", "obs/joint_pos"},
        {"qd", "qvel", "obs/qd", "obs/qvel", "obs/robot0_joint_vel", "obs/joint_vel"},
        {"tau_model", "tau", "u", "obs/tau", "ctrl", "actions"}};
    static const char *const keys[PARTS] = {"t", "q", "qd", "force"};
    const char *const wanted[PARTS] = {want->t, want->q, want->qd, want->force};
    *inputs = 0;
    if (want->states > 0 && get_states(place, group, want->states, part)) return -1;
    for (int p = want->states > 0 ? FORCE : T; p < PARTS; p++) {
        const int none = wanted[p] && !*wanted[p];
        const char *name = none ? NULL : choose(group, wanted[p], names[p]);
        if (!name && wanted[p] && !none)
            return refuse(place, "h5ls -r lists the names of a file", "there is no %s, which %s= names", wanted[p], keys[p]);
        if (name && get_array(place, group, name, &part[p])) return -1;
        if (name && p == FORCE) *inputs = strncmp(name, "tau", 3) != 0 && strcmp(name, "obs/tau") != 0;
    }
    return 0;
}

/* What of the parts does not fit together: 0, or -1. */
static int check_parts(const char *place, const layout *want, const array part[PARTS])
{
    static const char *const names[PARTS] = {"t", "q", "qd", "the force"};
    const array *q = &part[Q];
    if (!q->x || !part[QD].x)
        return refuse(place, "q= and qd= name them; h5ls -r lists the names of a file", "there is no %s", q->x ? "qd" : "q");
    if (!part[T].x && !(want->dt > 0)) return refuse(place, "give dt=, seconds from sample to sample, or t=", "there is no t");
    for (int p = T; p < PARTS; p++) {
        const array *a = &part[p];
        if (!a->x) continue;
        if (a->count * a->samples * (p == T ? a->n : 1) != q->count * q->samples || (p == QD && a->n != q->n))
            return refuse(place, "a recording has as many rows of q, qd, t and force, and q as many columns as qd",
                          "%s is [%d,%d,%d], q is [%d,%d,%d]", names[p], a->count, a->samples, a->n, q->count, q->samples, q->n);
        for (int i = 0; i < a->count * a->samples * a->n; i++)
            if (!(fabs(a->x[i]) < 3e38))
                return refuse(place, "only finite numbers can be learned from: end the recording before it, or make it two",
                              "row %d of %s has %g", i / a->n, names[p], a->x[i]);
    }
    return 0;
}

/* The parts become recordings. */
static int join(const char *place, demos *d, const layout *want, const array part[PARTS], int inputs, int test)
{
    const array *q = &part[Q], *qd = &part[QD], *tau = &part[FORCE], *t = &part[T];
    const int forces = tau->x ? tau->n : 0;
    if (check_parts(place, want, part)) return -1;
    if (d->count == 0) d->N = q->n, d->forces = forces, d->inputs = inputs || (forces > 0 && forces != q->n);
    if (d->N != q->n || d->forces != forces)
        return refuse(place, "all recordings of a file are of one machine",
                      "%d joints and %d forces, in recordings before it %d and %d", q->n, forces, d->N, d->forces);
    const size_t wide = (size_t)demos_wide(d), N = (size_t)d->N;
    double *row = malloc((size_t)q->samples * wide * sizeof *row);
    int bad = !row || (double)q->samples * (double)wide > INT_MAX;
    for (int k = 0; k < q->count && !bad; k++) {
        for (int i = 0; i < q->samples; i++) {
            const size_t at = (size_t)k * (size_t)q->samples + (size_t)i;
            double *to = row + (size_t)i * wide;
            to[0] = t->x ? t->x[at] : i * want->dt;
            memcpy(to + 1, q->x + at * N, N * sizeof *to), memcpy(to + 1 + N, qd->x + at * N, N * sizeof *to);
            if (forces) memcpy(to + 1 + 2 * N, tau->x + at * (size_t)forces, (size_t)forces * sizeof *to);
        }
        bad = demos_add(d, q->samples, test, row);
    }
    free(row);
    return bad ? refuse(place, "fewer or shorter recordings in a file", "more than there is memory for") : 0;
}

static int get_group(const char *path, demos *d, const layout *want, hid_t from, const char *name, int test)
{
    array part[PARTS] = {{0, 0, 0, 0, NULL}};
    char place[600];
    hid_t group = H5Gopen2(from, name, H5P_DEFAULT);
    int inputs = 0;
    snprintf(place, sizeof place, "%s: %s", path, name);
    const int bad = group < 0 ? refuse(place, "each name in data= is a recording, a group or a link to one",
                                       "no group that can be opened") :
        get_parts(place, group, want, part, &inputs) || join(place, d, want, part, inputs, test);
    for (int p = 0; p < PARTS; p++) free(part[p].x);
    if (group >= 0) H5Gclose(group);
    return bad;
}

/* Names of the links of a group. */
typedef struct {
    int count;
    char **name;
} names;

static herr_t add_name(hid_t group, const char *name, const H5L_info_t *info, void *to)
{
    names *n = to;
    char **more = realloc(n->name, (size_t)(n->count + 1) * sizeof *more), *copy = malloc(strlen(name) + 1);
    (void)group, (void)info;
    if (more) n->name = more;
    if (!more || !copy) {
        free(copy);
        return -1;
    }
    n->name[n->count++] = strcpy(copy, name);
    return 0;
}

/* The order of people: demo_2 before demo_10. */
static int natural(const void *a, const void *b)
{
    const char *x = *(char *const *)a, *y = *(char *const *)b, *const whole = x, *const other = y;
    while (*x && *y) {
        if (isdigit((unsigned char)*x) && isdigit((unsigned char)*y)) {
            const size_t zeros = strspn(x, "0"), more = strspn(y, "0"), n = strspn(x += zeros, "0123456789");
            const size_t m = strspn(y += more, "0123456789");
            const int order = n != m ? (n > m) - (n < m) : strncmp(x, y, n);
            if (order) return order;
            x += n, y += m;
        } else if (*x != *y) {
            return (unsigned char)*x < (unsigned char)*y ? -1 : 1;
        } else {
            x++, y++;
        }
    }
    return *x || *y ? (*x != 0) - (*y != 0) : strcmp(whole, other);
}

/* Every link of a group is a recording. */
static int get_demos(const char *path, demos *d, const layout *want, hid_t data)
{
    names all = {0, NULL};
    int bad = H5Literate(data, H5_INDEX_NAME, H5_ITER_INC, NULL, add_name, &all) < 0 ?
        refuse(path, "is the file whole?", "the names of recordings cannot be read") :
        0;
    if (all.count > 0) qsort(all.name, (size_t)all.count, sizeof *all.name, natural);
    for (int k = 0; k < all.count && !bad; k++) bad = get_group(path, d, want, data, all.name[k], 0);
    if (!bad && all.count == 0) bad = refuse(path, "data= names the group that has a group for each recording", "no recordings");
    for (int k = 0; k < all.count; k++) free(all.name[k]);
    free(all.name);
    return bad;
}

int demos_read_h5(demos *d, const layout *want, const char *path)
{
    static const char *const lists[] = {"train", "test", "tune"};
    const char *data = want->data ? want->data : "data";
    int bad = 0;
    memset(d, 0, sizeof *d);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) return refuse(path, "is the path right, and the file whole?", "not there, or no HDF5");
    if (there(file, data)) {
        hid_t group = H5Gopen2(file, data, H5P_DEFAULT);
        bad = group < 0 ? refuse(path, "data= names the group that has a group for each recording", "%s is no group", data) :
                          get_demos(path, d, want, group);
        if (group >= 0) H5Gclose(group);
    } else if (want->data || !there(file, lists[0])) {
        bad = refuse(path, "data= names the group that has a group for each recording", "no group %s%s", data,
                     want->data ? "" : " or train");
    } else {
        for (int i = 0; i < 3 && !bad; i++)
            if (there(file, lists[i])) bad = get_group(path, d, want, file, lists[i], i > 0);
    }
    H5Fclose(file);
    if (bad) demos_free(d);
    return bad ? -1 : 0;
}
