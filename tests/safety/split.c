/* SPDX-License-Identifier: MIT */
/* split.c - torques of control ticks, compared by numerics.sh: of MODEL, in float; with -DROLN_DOUBLE the same weights in double;
   with -DROLN_QUANTISE=half or int8 the stored ones.

       split float FOLDER [MODEL.roln]   the weights of MODEL_weights.h, with -DHERE, or of the file; writes bytes, numbers, states
                                         to FOLDER, and with a plant, -DPLANT=NAME_plant.h, the torques of that, plant
       split double FOLDER, split store FOLDER
   The feedforward of the model at random states in the middle half of the range seen in training, with accelerations of up to
   2 zd_max a second and gains of 0: one line on stdout for each state. */
#include <stdio.h>
#include <string.h>

#define STRING_(x) #x
#define STRING(x) STRING_(x)
#define HEADER_(m) STRING(m.h)
#define HEADER(m) HEADER_(m)
#include HEADER(MODEL)
#define CAT_(a, b) a##_##b
#define CAT(a, b) CAT_(a, b)
#define M(name) CAT(MODEL, name)
#ifdef HERE
#include STRING(HERE)
#endif
#ifdef PLANT
#include STRING(PLANT)
#endif

enum { N = M(N), n = M(n), STATES = 1000 };
static M(params) p;

static FILE *file(const char *folder, const char *name, const char *how)
{
    char path[500];
    FILE *f;
    snprintf(path, sizeof path, "%s/%s", folder, name);
    f = fopen(path, how);
    if (!f) perror(path);
    return f;
}

static void put(FILE *f, int count, const roln_real *x)
{
    for (int i = 0; i < count; i++)
        fprintf(f, "%.17g%c", (double)x[i], i + 1 < count ? ' ' : '\n');
}

static int get(FILE *f, int count, roln_real *x)
{
    for (int i = 0; i < count; i++) {
        double v;
        if (fscanf(f, "%lf", &v) != 1) return 0;
        x[i] = (roln_real)v;
    }
    return 1;
}

#ifdef PLANT
/* Of the arm and of the Furuta pendulum. */
static void true_torque(const roln_real *x, const roln_real *qdd, roln_real *tau)
{
    double q[N], v[N], a[N], t[N];
    for (int i = 0; i < N; i++) q[i] = (double)x[i], v[i] = (double)x[N + i], a[i] = (double)qdd[i];
#ifdef ARM
    {
        const double si = sin(q[1]), co = cos(q[1]), b = MASS * ROD * ROD / 3, E = MASS * ARM * ROD / 2 * co;
        t[0] = (TURNED + MASS * ARM * ARM + b * si * si) * a[0] + E * a[1] + viscous[0] * v[0] + 2 * b * si * co * v[0] * v[1] -
               MASS * ARM * ROD / 2 * si * v[1] * v[1];
        t[1] = E * a[0] + b * a[1] - b * si * co * v[0] * v[0] + viscous[1] * v[1] + MASS * GRAVITY * ROD / 2 * si;
    }
#else
    inverse(q, v, a, GRAVITY, t);
    for (int i = 0; i < N; i++) t[i] += link_of[i].friction * v[i];
#endif
    for (int i = 0; i < N; i++) tau[i] = (roln_real)t[i];
}
#endif

#if !defined(ROLN_DOUBLE) && !defined(STORED)
/* The weights, and the states: q, qd, z, zd, zdd. */
static int prepare(const char *folder, const char *path)
{
    static unsigned char bytes[M(packed_size) + 1];
    static M(work) work;
    uint64_t seed = 1;
    FILE *f;
#ifdef HERE
    p = M(weights);
    if (path) return 0;
    M(pack)(&p, bytes);
#else
    if (!path || !(f = fopen(path, "rb"))) return 0;
    if (M(unpack)((int)fread(bytes, 1, sizeof bytes, f), bytes, &p) != ROLN_OK || fclose(f)) return 0;
#endif
    if (!(f = file(folder, "bytes", "wb")) || fwrite(bytes, 1, M(packed_size), f) != M(packed_size) || fclose(f)) return 0;
    if (!(f = file(folder, "numbers", "w"))) return 0;
    put(f, M(numbers), &p.slope);
    fclose(f);
    if (!(f = file(folder, "states", "w"))) return 0;
    for (int k = 0; k < STATES; k++) {
        M(latent) s;
        M(state) x;
        roln_real zdd[n];
        for (int i = 0; i < n; i++) {
            s.z[i] = p.z_min[i] + (p.z_max[i] - p.z_min[i]) * (roln_uniform(&seed) / 2 + 0.25f);
            s.zd[i] = p.zd_max[i] * (roln_uniform(&seed) - 0.5f);
            zdd[i] = 2 * p.zd_max[i] * (2 * roln_uniform(&seed) - 1);
        }
        if (M(decode)(&p, &s, &x, &work.decode) != ROLN_OK) return 0;
        put(f, N, x.q), put(f, N, x.qd), put(f, n, s.z), put(f, n, s.zd), put(f, n, zdd);
    }
    return !fclose(f);
}
#else
static int prepare(const char *folder, const char *path)
{
    FILE *f;
    if (path) return 0;
#ifdef STORED
    {
        static unsigned char bytes[M(full_packed_size) + 1];
        static M(start) start;
        f = file(folder, "bytes", "rb");
        return f && M(quantise)((int)fread(bytes, 1, sizeof bytes, f), bytes, &p, &start.quantise) == ROLN_OK && !fclose(f);
    }
#else
    {
        static M(start) start;
        roln_real slope, least;
        uint64_t seed = 1;
        if (M(init)(&p, &seed, &start.init) != ROLN_OK) return 0;
        slope = p.slope, least = p.eigenvalue_floor; /* of the config, in double */
        if (!(f = file(folder, "numbers", "r")) || !get(f, M(numbers), &p.slope)) return 0;
        p.slope = slope, p.eigenvalue_floor = least;
        return !fclose(f);
    }
#endif
}
#endif

int main(int argc, char **argv)
{
    static const roln_limits limits = {.dt = ROLN_C(0.001), .margin = 1, .tau = ROLN_C(1e9), .hold = 5};
    static M(work) work;
    FILE *f, *plant = NULL;
    if (argc < 3 || !prepare(argv[2], argc > 3 ? argv[3] : NULL) || !(f = file(argv[2], "states", "r"))) return 1;
#ifdef PLANT
    if (!(plant = file(argv[2], "plant", "w"))) return 1;
#endif
    for (int k = 0; k < STATES; k++) {
        static M(target) ref;
        M(state) x;
        M(latent) s;
        M(guard) guard;
        memset(&guard, 0, sizeof guard);
        if (!get(f, N, x.q) || !get(f, N, x.qd) || !get(f, n, ref.z) || !get(f, n, ref.zd) || !get(f, n, ref.zdd)) return 1;
        if (M(tick)(&p, &limits, &x, &ref, &s, &guard, &work.tick) != 0) return fprintf(stderr, "a fault\n"), 1;
        put(stdout, N, guard.tau);
#ifdef PLANT
        {
            roln_real both[2 * N], qdd[N], tau[N];
            memcpy(both, x.q, sizeof x.q), memcpy(both + N, x.qd, sizeof x.qd);
            for (int i = 0; i < N; i++)
                qdd[i] = ref.zdd[i] * x.qd[i] / ref.zd[i]; /* no autoencoder: z is q in a unit of its own */
            true_torque(both, qdd, tau);
            put(plant, N, tau);
        }
#endif
    }
    return plant && fclose(plant);
}
