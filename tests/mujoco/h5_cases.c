/* SPDX-License-Identifier: MIT */
/* h5_cases CASE FILE.h5 - recordings of two joints as strangers store them, for convert: 40 samples of q = sin, and one thing that
   is particular. The cases that convert reads hold the same numbers, but for int and f32. */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include <hdf5.h>

enum { S = 40, N = 2 };
static const char *which;

static int is(const char *name) { return strcmp(which, name) == 0; }

static void put(hid_t group, const char *name, int rank, const hsize_t *shape, hid_t type, const double *x)
{
    const hsize_t chunk[4] = {8, shape[1] < 8 ? shape[1] : 8, 1, 1};
    hid_t space = H5Screate_simple(rank, shape, NULL), plist = H5Pcreate(H5P_DATASET_CREATE);
    if (is("packed")) H5Pset_chunk(plist, rank, chunk), H5Pset_shuffle(plist), H5Pset_deflate(plist, 6), H5Pset_fletcher32(plist);
    if (is("huge")) H5Pset_chunk(plist, rank, chunk);
    hid_t set = H5Dcreate2(group, name, type, space, H5P_DEFAULT, plist, H5P_DEFAULT);
    if (x) H5Dwrite(set, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, x);
    H5Dclose(set), H5Pclose(plist), H5Sclose(space);
}

static void attributes(hid_t on)
{
    const double x = 7;
    hid_t space = H5Screate(H5S_SCALAR), a = H5Acreate2(on, "num_samples", H5T_NATIVE_DOUBLE, space, H5P_DEFAULT, H5P_DEFAULT);
    H5Awrite(a, H5T_NATIVE_DOUBLE, &x);
    H5Aclose(a), H5Sclose(space);
}

/* Recording number k, from time `from` on. */
static void demo(hid_t data, const char *name, int k)
{
    static double t[S], q[S * N], qd[S * N];
    const hsize_t shape[4] = {is("none") ? 0 : S, is("wide") && k == 1 ? 1 : N, 1, 1};
    hsize_t other[4] = {S, N, 1, 1};
    const hid_t type = is("f32") ? H5T_IEEE_F32LE : is("big") ? H5T_IEEE_F64BE : is("int") ? H5T_STD_I16BE : H5T_IEEE_F64LE;
    const double from = is("epoch") ? 1.7e9 : is("uptime") ? 1234567 : is("nanoseconds") ? 1.7e18 : 0;
    for (int i = 0; i < S; i++) {
        t[i] = from + (is("nanoseconds") ? 1e7 : 0.01) * i;
        if (is("twice") && k == 1 && i == 20) t[i] = t[i - 1];
        for (int j = 0; j < N; j++) {
            const double w = 2 + j, at = w * 0.01 * i + k;
            q[i * N + j] = is("int") ? 100 * i + k : sin(at), qd[i * N + j] = is("int") ? 10000 : w * cos(at);
        }
    }
    if (is("nan") && k == 1) q[7 * N + 1] = NAN;
    if (is("inf") && k == 1) qd[3 * N] = INFINITY;
    if (is("1e39") && k == 1) qd[3 * N] = 1e39;
    hid_t group = H5Gcreate2(data, name, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    if (is("attributes")) attributes(group);
    other[0] = is("ragged") && k == 1 ? S - 1 : S;
    if (is("huge")) other[0] = (hsize_t)1 << 31;
    put(group, "t", 1, shape, is("nanoseconds") ? H5T_STD_I64LE : is("int") ? H5T_IEEE_F64LE : type, t);
    if (!(is("missing") && k == 1)) put(group, "q", is("rank") && k == 1 ? 4 : 2, shape, type, q);
    other[1] = is("shape") && k == 1 ? 1 : shape[1];
    put(group, "qd", 2, is("none") ? shape : other, is("text") && k == 1 ? H5T_C_S1 : type, is("huge") || is("text") ? NULL : qd);
    H5Gclose(group);
}

int main(int argc, char **argv)
{
    if (argc != 3) return 2;
    which = argv[1];
    const char *const slash = strrchr(argv[2], '/'), *const file_name = slash ? slash + 1 : argv[2];
    hid_t file = H5Fcreate(argv[2], H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT);
    hid_t data = H5Gcreate2(file, is("root") ? "/other" : "data", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT);
    hid_t other = is("links") ? H5Gcreate2(file, "other", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT) : data;
    for (int k = 0; k < 12; k++) { /* created out of order */
        const int number = (5 * k + 3) % 12;
        char name[40], to[80];
        const char *form = is("padded") ? "demo_%02d" : is("episodes") ? "episode %d, \xc3\xa9" : is("numbers") ? "%d" :
            is("suffix") && number % 2 ? "demo_%d_aug" : is("large") ? "demo_100000000%d" : is("newline") ? "demo\n%d" : "demo_%d";
        snprintf(name, sizeof name, form, number);
        demo(other, name, number);
        if (!is("links")) continue;
        snprintf(to, sizeof to, "/other/%s", name);
        if (number % 2) H5Lcreate_soft(to, data, name, H5P_DEFAULT, H5P_DEFAULT);
        else H5Lcreate_external(file_name, to, data, name, H5P_DEFAULT, H5P_DEFAULT);
    }
    if (is("dangling")) H5Lcreate_soft("/nowhere", data, "demo_5b", H5P_DEFAULT, H5P_DEFAULT);
    if (is("outside")) H5Lcreate_external("nowhere.h5", "/demo", data, "demo_5b", H5P_DEFAULT, H5P_DEFAULT);
    if (is("circle")) H5Lcreate_soft("demo_5b", data, "demo_5b", H5P_DEFAULT, H5P_DEFAULT);
    if (is("dataset")) put(data, "demo_5b", 1, (const hsize_t[]){S, N, 1, 1}, H5T_NATIVE_INT, NULL);
    if (is("empty")) H5Gclose(H5Gcreate2(data, "demo_5b", H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT));
    if (is("links")) H5Gclose(other);
    H5Gclose(data);
    return H5Fclose(file) < 0;
}
