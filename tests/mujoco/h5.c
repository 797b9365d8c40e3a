/* SPDX-License-Identifier: MIT */
#include "h5.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <hdf5.h>
#include <mujoco/mujoco.h>

#define ARRAYS 10

static const struct {
    const char *name;
    int per_joint, per_latent;
} arrays[ARRAYS] = {
    {"t", 0, 0}, {"e_kin", 0, 0}, {"e_pot", 0, 0}, {"q", 1, 0}, {"qd", 1, 0}, {"qdd", 1, 0},
    {"tau", 1, 0}, {"tau_model", 1, 0}, {"z", 0, 1}, {"zd", 0, 1},
};

static void array_pointers(const struct truth_set *s, double *p[ARRAYS])
{
    double *all[ARRAYS] = {s->t, s->e_kin, s->e_pot, s->q, s->qd, s->qdd, s->tau, s->tau_model, s->z, s->zd};
    memcpy(p, all, sizeof all);
}

static int array_shape(const struct truth_set *s, int i, hsize_t shape[3])     /* rank */
{
    shape[0] = (hsize_t)s->count;
    shape[1] = (hsize_t)s->samples;
    shape[2] = (hsize_t)(arrays[i].per_latent ? s->latent : s->dof);
    return arrays[i].per_joint || arrays[i].per_latent ? 3 : 2;
}

static hsize_t chunk_length(int samples)    /* the largest divisor of a trajectory up to 1000 samples */
{
    int n = samples < 1000 ? samples : 1000;
    while (samples % n) n--;
    return (hsize_t)n;
}

/* ---- writing ---- */

static int put_attribute(hid_t group, const char *name, hid_t type, const void *value)
{
    hid_t space = H5Screate(H5S_SCALAR);
    hid_t a = H5Acreate2(group, name, type, space, H5P_DEFAULT, H5P_DEFAULT);
    herr_t bad = a < 0 || H5Awrite(a, type, value) < 0;
    if (a >= 0) H5Aclose(a);
    H5Sclose(space);
    return bad ? -1 : 0;
}

static int put_string(hid_t group, const char *name, const char *value)
{
    hid_t type = H5Tcopy(H5T_C_S1);
    H5Tset_size(type, strlen(value) + 1);
    int bad = put_attribute(group, name, type, value);
    H5Tclose(type);
    return bad;
}

static int put_array(hid_t group, const struct truth_set *s, int i, const double *x)
{
    hsize_t shape[3], chunk[3];
    int rank = array_shape(s, i, shape);
    memcpy(chunk, shape, sizeof chunk);
    chunk[0] = 1;
    chunk[1] = chunk_length(s->samples);
    hid_t space = H5Screate_simple(rank, shape, NULL), dcpl = H5Pcreate(H5P_DATASET_CREATE);
    H5Pset_chunk(dcpl, rank, chunk);
    H5Pset_obj_track_times(dcpl, 0);        /* no time stamps: the same bytes from run to run */
    hid_t set = H5Dcreate2(group, arrays[i].name, H5T_IEEE_F64LE, space, H5P_DEFAULT, dcpl, H5P_DEFAULT);
    herr_t bad = set < 0 || H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) < 0;
    if (set >= 0) H5Dclose(set);
    H5Pclose(dcpl);
    H5Sclose(space);
    return bad ? -1 : 0;
}

static int put_set(hid_t file, const char *name, const struct truth_set *s)
{
    hid_t group = H5Gcreate2(file, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (group < 0) return -1;
    int stride = (int)lround(s->dt / s->dt_sim);
    int bad = put_string(group, "system", truth_name(s->system)) || put_string(group, "mujoco_version", mj_versionString())
        || put_string(group, "model_xml", s->model_xml) || put_attribute(group, "dt", H5T_NATIVE_DOUBLE, &s->dt)
        || put_attribute(group, "dt_sim", H5T_NATIVE_DOUBLE, &s->dt_sim)
        || put_attribute(group, "stride", H5T_NATIVE_INT, &stride) || put_attribute(group, "seed", H5T_NATIVE_UINT64, &s->seed);
    double *p[ARRAYS];
    array_pointers(s, p);
    for (int i = 0; i < ARRAYS && !bad; i++)
        if (p[i]) bad = put_array(group, s, i, p[i]);
    H5Gclose(group);
    return bad ? -1 : 0;
}

int truth_h5_write(const char *path, const struct truth_set sets[TRUTH_SPLITS])
{
    hid_t file = H5Fcreate(path, H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    if (file < 0) return -1;
    int bad = 0;
    for (int i = 0; i < TRUTH_SPLITS && !bad; i++) bad = put_set(file, truth_split_name((enum truth_split)i), &sets[i]);
    return H5Fclose(file) < 0 || bad ? -1 : 0;
}

/* ---- reading ---- */

static int get_attribute(hid_t group, const char *name, hid_t type, void *value)
{
    hid_t a = H5Aopen(group, name, H5P_DEFAULT);
    if (a < 0) return -1;
    herr_t bad = H5Aread(a, type, value) < 0;
    H5Aclose(a);
    return bad ? -1 : 0;
}

static char *get_string(hid_t group, const char *name)     /* malloc'ed, or NULL */
{
    hid_t a = H5Aopen(group, name, H5P_DEFAULT);
    if (a < 0) return NULL;
    hid_t type = H5Aget_type(a);
    char *s = calloc(H5Tget_size(type) + 1, 1);
    if (s && H5Aread(a, type, s) < 0) {
        free(s);
        s = NULL;
    }
    H5Tclose(type);
    H5Aclose(a);
    return s;
}

/* The dataset's shape must be the expected one; with x == NULL only count and samples are taken from it. */
static int get_array(hid_t group, struct truth_set *s, int i, double *x)
{
    hsize_t shape[3], found[3] = {0};
    hid_t set = H5Dopen2(group, arrays[i].name, H5P_DEFAULT);
    if (set < 0) return -1;
    hid_t space = H5Dget_space(set);
    int rank = array_shape(s, i, shape), bad = H5Sget_simple_extent_ndims(space) != rank;
    if (!bad) H5Sget_simple_extent_dims(space, found, NULL);
    if (!bad && !x) {
        s->count = (int)found[0];
        s->samples = (int)found[1];
    } else if (!bad) {
        bad = memcmp(found, shape, (size_t)rank * sizeof *shape) != 0
            || H5Dread(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x) < 0;
    }
    H5Sclose(space);
    H5Dclose(set);
    return bad ? -1 : 0;
}

static int get_set(hid_t file, const char *name, struct truth_set *s)
{
    struct truth_set size = {0};
    enum truth_system system;
    hid_t group = H5Gopen2(file, name, H5P_DEFAULT);
    if (group < 0) return -1;
    char *system_name = get_string(group, "system");
    int bad = !system_name || truth_find(system_name, &system) || get_array(group, &size, 0, NULL)
        || truth_alloc(s, system, size.count, size.samples);
    free(system_name);
    if (!bad) {
        free(s->model_xml);
        s->model_xml = get_string(group, "model_xml");
        bad = !s->model_xml || get_attribute(group, "dt", H5T_NATIVE_DOUBLE, &s->dt)
            || get_attribute(group, "dt_sim", H5T_NATIVE_DOUBLE, &s->dt_sim)
            || get_attribute(group, "seed", H5T_NATIVE_UINT64, &s->seed);
        double *p[ARRAYS];
        array_pointers(s, p);
        for (int i = 0; i < ARRAYS && !bad; i++)
            if (p[i]) bad = get_array(group, s, i, p[i]);
        if (bad) truth_free(s);
    }
    H5Gclose(group);
    return bad ? -1 : 0;
}

int truth_h5_read(const char *path, struct truth_set sets[TRUTH_SPLITS])
{
    memset(sets, 0, TRUTH_SPLITS * sizeof *sets);
    hid_t file = H5Fopen(path, H5F_ACC_RDONLY, H5P_DEFAULT);
    if (file < 0) return -1;
    int bad = 0;
    for (int i = 0; i < TRUTH_SPLITS && !bad; i++) bad = get_set(file, truth_split_name((enum truth_split)i), &sets[i]);
    for (int i = 0; i < TRUTH_SPLITS && bad; i++) truth_free(&sets[i]);
    H5Fclose(file);
    return bad ? -1 : 0;
}
