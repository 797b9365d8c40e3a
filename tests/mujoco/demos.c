/* SPDX-License-Identifier: MIT */
#include "demos.h"

#include <math.h>
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

int demos_write_csv(const demos *d, int test, const char *path)
{
    const int wide = demos_wide(d);
    FILE *f = fopen(path, "w");
    if (!f) {
        perror(path);
        return -1;
    }
    fputs("t", f), header(f, "q", d->N), header(f, "qd", d->N), header(f, d->inputs ? "u" : "tau", d->forces);
    fputc('\n', f);
    for (int k = 0, written = 0; k < d->count; k++) {
        if (d->demo[k].test != test) continue;
        if (written++) fputc('\n', f);
        for (int i = 0; i < d->demo[k].samples * wide; i++)
            fprintf(f, "%.9g%c", d->demo[k].row[i], (i + 1) % wide ? ',' : '\n');
    }
    const int bad = ferror(f);
    if (!fclose(f) && !bad) return 0;
    perror(path);
    return -1;
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

/* A dataset of numbers, [count][S][n], [S][n] or [S]. */
typedef struct {
    int rank, count, samples, n;
    double *x;
} array;

static int get_array(hid_t group, const char *name, array *a)
{
    hsize_t shape[3] = {1, 1, 1};
    hid_t set = H5Dopen2(group, name, H5P_DEFAULT), space = set < 0 ? -1 : H5Dget_space(set);
    hid_t type = set < 0 ? -1 : H5Dget_type(set);
    memset(a, 0, sizeof *a);
    a->rank = space < 0 ? 0 : H5Sget_simple_extent_ndims(space);
    int bad = a->rank < 1 || a->rank > 3 || (H5Tget_class(type) != H5T_FLOAT && H5Tget_class(type) != H5T_INTEGER);
    if (!bad) {
        H5Sget_simple_extent_dims(space, shape + (a->rank == 3 ? 0 : 1), NULL);
        a->count = (int)shape[0], a->samples = (int)shape[1], a->n = (int)shape[2];
        a->x = malloc((size_t)(shape[0] * shape[1] * shape[2] + 1) * sizeof *a->x);
        bad = !a->x || H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, a->x) < 0;
    }
    if (bad) fprintf(stderr, "%s: no array of numbers of rank 1 to 3\n", name);
    if (type >= 0) H5Tclose(type);
    if (space >= 0) H5Sclose(space);
    if (set >= 0) H5Dclose(set);
    return bad ? -1 : 0;
}

/* Nonzero if there is such a name, a path of several, too. */
static int there(hid_t group, const char *name)
{
    char path[256];
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

static int get_parts(hid_t group, const layout *want, array part[PARTS], int *inputs)
{
    static const char *const names[PARTS][7] = {
        {"t", "time", "obs/t", "obs/time"}, {"q", "qpos", "obs/q", "obs/qpos", "obs/robot0_joint_pos", "obs/joint_pos"},
        {"qd", "qvel", "obs/qd", "obs/qvel", "obs/robot0_joint_vel", "obs/joint_vel"},
        {"tau_model", "tau", "u", "obs/tau", "ctrl", "actions"}};
    const char *const wanted[PARTS] = {want->t, want->q, want->qd, want->force};
    array s;
    *inputs = 0;
    if (want->states > 0) {
        if (get_array(group, "states", &s)) return -1;
        if (s.rank != 2 || s.n < 1 + 2 * want->states) {
            fprintf(stderr, "states has %d columns, t, q and qd of %d joints have %d\n", s.n, want->states, 1 + 2 * want->states);
            free(s.x);
            return -1;
        }
        for (int p = T; p <= QD; p++) {
            const int n = p == T ? 1 : want->states, from = p == T ? 0 : p == Q ? 1 : 1 + n;
            array a = {2, 1, s.samples, n, malloc((size_t)(s.samples * n + 1) * sizeof(double))};
            for (int i = 0; a.x && i < s.samples * n; i++) a.x[i] = s.x[i / n * s.n + from + i % n];
            part[p] = a;
        }
        free(s.x);
    }
    for (int p = want->states > 0 ? FORCE : T; p < PARTS; p++) {
        const int none = wanted[p] && !*wanted[p];
        const char *name = none ? NULL : choose(group, wanted[p], names[p]);
        if (!name && wanted[p] && !none) {
            fprintf(stderr, "there is no %s\n", wanted[p]);
            return -1;
        }
        if (name && get_array(group, name, &part[p])) return -1;
        if (name && p == FORCE) *inputs = strncmp(name, "tau", 3) != 0 && strcmp(name, "obs/tau") != 0;
    }
    return 0;
}

/* The parts become recordings. */
static int join(demos *d, const layout *want, const array part[PARTS], int inputs, int test)
{
    const array *q = &part[Q], *qd = &part[QD], *tau = &part[FORCE], *t = &part[T];
    const int forces = tau->x ? tau->n : 0;
    if (!q->x || !qd->x || q->n != qd->n || q->samples != qd->samples || q->count != qd->count) {
        fprintf(stderr, "q and qd are missing, or differ in shape\n");
        return -1;
    }
    if (!t->x && !(want->dt > 0)) {
        fprintf(stderr, "there is no t: give dt=, seconds from sample to sample\n");
        return -1;
    }
    for (int p = T; p < PARTS; p += FORCE - T)
        if (part[p].x && part[p].samples * part[p].count * (p == T ? part[p].n : 1) != q->samples * q->count) {
            fprintf(stderr, "%s has another length than q\n", p == T ? "t" : "the force");
            return -1;
        }
    if (d->count == 0) d->N = q->n, d->forces = forces, d->inputs = inputs || (forces > 0 && forces != q->n);
    if (d->N != q->n || d->forces != forces) {
        fprintf(stderr, "recording %d has %d joints and %d forces, those before it %d and %d\n", d->count, q->n, forces, d->N,
                d->forces);
        return -1;
    }
    const int wide = demos_wide(d), N = d->N;
    double *row = malloc((size_t)(q->samples * wide + 1) * sizeof *row);
    int bad = !row;
    for (int k = 0; k < q->count && !bad; k++) {
        for (int i = 0; i < q->samples; i++) {
            const int at = k * q->samples + i;
            double *to = row + i * wide;
            to[0] = t->x ? t->x[at] : i * want->dt;
            memcpy(to + 1, q->x + at * N, (size_t)N * sizeof *to), memcpy(to + 1 + N, qd->x + at * N, (size_t)N * sizeof *to);
            if (forces) memcpy(to + 1 + 2 * N, tau->x + at * forces, (size_t)forces * sizeof *to);
        }
        bad = demos_add(d, q->samples, test, row);
    }
    free(row);
    return bad ? -1 : 0;
}

static int get_group(demos *d, const layout *want, hid_t from, const char *name, int test)
{
    array part[PARTS] = {{0, 0, 0, 0, NULL}};
    hid_t group = H5Gopen2(from, name, H5P_DEFAULT);
    int inputs = 0, bad = group < 0 || get_parts(group, want, part, &inputs) || join(d, want, part, inputs, test);
    if (bad) fprintf(stderr, "in %s\n", name);
    for (int p = 0; p < PARTS; p++) free(part[p].x);
    if (group >= 0) H5Gclose(group);
    return bad;
}

/* demo_0, demo_1 ..; whatever numbers are left out. */
static int get_demos(demos *d, const layout *want, hid_t data)
{
    H5G_info_t info;
    char name[32];
    H5Gget_info(data, &info);
    for (int k = 0, found = 0; found < (int)info.nlinks && k < 1000000; k++) {
        snprintf(name, sizeof name, "demo_%d", k);
        if (H5Lexists(data, name, H5P_DEFAULT) <= 0) continue;
        found++;
        if (get_group(d, want, data, name, 0)) return -1;
    }
    if (d->count == 0) fprintf(stderr, "no group demo_0, demo_1 ..\n");
    return d->count == 0;
}

int demos_read_h5(demos *d, const layout *want, const char *path)
{
    static const char *const lists[] = {"train", "test", "tune"};
    const char *data = want->data ? want->data : "data";
    int bad = 0;
    memset(d, 0, sizeof *d);
    H5Eset_auto2(H5E_DEFAULT, NULL, NULL);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) {
        fprintf(stderr, "%s: not there, or no HDF5\n", path);
        return -1;
    }
    if (there(file, data)) {
        hid_t group = H5Gopen2(file, data, H5P_DEFAULT);
        bad = group < 0 || get_demos(d, want, group);
        if (group >= 0) H5Gclose(group);
    } else if (want->data || !there(file, lists[0])) {
        fprintf(stderr, "%s: no group %s%s\n", path, data, want->data ? "" : " or train");
        bad = 1;
    }
    for (int i = 0; i < 3 && !bad && d->count >= 0 && !there(file, data); i++)
        if (there(file, lists[i])) bad = get_group(d, want, file, lists[i], i > 0);
    H5Fclose(file);
    if (bad) demos_free(d);
    return bad ? -1 : 0;
}
