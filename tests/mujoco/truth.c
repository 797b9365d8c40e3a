/* SPDX-License-Identifier: MIT */
#include "truth.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include <mujoco/mujoco.h>

#define PI 3.14159265358979323846
#define DOF_MAX 600
#define XML_MAX 16384

static const struct {
    const char *name;
    int dof, latent, samples, stride;
    double dt_sim;
} specs[TRUTH_SYSTEMS] = {
    {"pend2", 2, 0, 3000, 1, 1e-3},
    {"pend2_act", 2, 0, 3000, 1, 1e-3},
    {"pend16", 16, 4, 3000, 1, 1e-3},
    {"pend16_act", 16, 4, 3000, 1, 1e-3},
    {"pend16_pd", 16, 4, 3000, 1, 1e-3},
    {"pend16_narrow", 16, 4, 3000, 1, 1e-3},
    {"pend16_soft", 16, 0, 3000, 1, 1e-3},
    {"wave16", 16, 4, 3000, 1, 1e-3},
    {"wave16_soft", 16, 0, 3000, 1, 1e-3},
    {"rope", 192, 0, 1000, 5, 2e-4},
    {"cloth", 600, 0, 250, 10, 1e-4},
};

/* Beads on sliders, springs to the neighbours along the grid (main) and along one diagonal of each cell (shear). */
static const struct grid {
    int columns, rows, pinned;                  /* pinned: bead 0 stays where it is */
    double mass, spacing, stiffness[2], damping[2];     /* [main, shear]; kg, m, N/m, N s/m */
} rope = {65, 1, 1, .005, .02, {2000, 0}, {0, 0}}, cloth = {20, 10, 0, .001, .02, {100, 20}, {.2, .05}};

#define GRAVITY 9.81
#define SPHERE .1       /* radius of what the cloth falls on */
#define BEAD .005       /* radius of a bead of the cloth     */
#define FALL .05

static const struct grid *grid_of(enum truth_system system)
{
    return system == TRUTH_ROPE ? &rope : system == TRUTH_CLOTH ? &cloth : NULL;
}

/* pend16: joint i = a1 x + a2 x^2 + a3 x^3 + a4 x^4 of x = z[i/4], the first joint of its block. */
static const double polynomial[16][4] = {
    {1, 0, 0, 0}, {.8, .4025, 0, 0}, {-.65, .175, .255, 0}, {.255, -.45, 0, .156},
    {1, 0, 0, 0}, {.56, .2975, 0, 0}, {-.5, .2875, .39, 0}, {.39, -.315, 0, .12},
    {1, 0, 0, 0}, {.92, .455, 0, 0}, {-.35, .2125, .3, 0}, {.3, -.5175, 0, .084},
    {1, 0, 0, 0}, {.68, .35, 0, 0}, {-.575, .325, .21, 0}, {.21, -.3825, 0, .138},
};

/* wave16: joint i = l x + a sin(b x) + c (1 - cos(d x)) + e tanh(f x), row l a b c d e f. Of such motion linear
   POD with n = 4 leaves 20 % as of pend16, polynomials in z of degree 4, 6 and 8 leave .9, .13 and .025 %. */
static const double wave[16][7] = {
    {1, 0, 0, 0, 0, 0, 0}, {0, .42, 1.9, .32, 1.6, 0, 0}, {0, .16, 2.3, 0, 0, -.62, 1.6}, {0, 0, 0, -.32, 1.8, .2, 1.5},
    {1, 0, 0, 0, 0, 0, 0}, {0, 0, 0, .24, 1.7, .34, 1.7}, {0, -.32, 2.3, .17, 2, 0, 0}, {0, .18, 2, -.24, 1.8, 0, 0},
    {1, 0, 0, 0, 0, 0, 0}, {0, .3, 2.1, .3, 1.8, .16, 1.8}, {0, -.22, 2.2, .18, 1.9, 0, 0}, {0, 0, 0, -.3, 1.9, .22, 1.8},
    {1, 0, 0, 0, 0, 0, 0}, {0, .54, 1.2, .5, 1.1, 0, 0}, {0, 0, 0, .36, 1.2, -.56, .95}, {0, .24, 1.3, -.54, 1.1, 0, 0},
};

static int is_wave(enum truth_system system) { return system == TRUTH_WAVE16 || system == TRUTH_WAVE16_SOFT; }

/* ---- random numbers: splitmix64, one stream per (seed, split, trajectory) ---- */

static uint64_t mix(uint64_t x)
{
    x = (x ^ (x >> 30)) * UINT64_C(0xbf58476d1ce4e5b9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94d049bb133111eb);
    return x ^ (x >> 31);
}

static double uniform(uint64_t *state, double low, double high)
{
    *state += UINT64_C(0x9e3779b97f4a7c15);
    return low + (high - low) * ((double)(mix(*state) >> 11) * 0x1p-53);
}

/* Keys of train and test are 2 seed + 1 and 2 seed + 2, those of tune stand at the other end: of seeds below 2^62 no two are
   equal. */
static uint64_t stream(uint64_t seed, enum truth_split split, int trajectory)
{
    const uint64_t key = split == TRUTH_TUNE ? ~(2 * seed) : 2 * seed + (split == TRUTH_TEST) + 1;
    return mix(mix(key) + (uint64_t)trajectory + 1);
}

/* ---- models ---- */

struct text {
    char s[XML_MAX];
    size_t n;
};

static void append(struct text *x, const char *format, ...)
{
    va_list args;
    va_start(args, format);
    int n = vsnprintf(x->s + x->n, XML_MAX - x->n, format, args);
    va_end(args);
    x->n += (size_t)n;
    if (n < 0 || x->n >= XML_MAX) {
        fprintf(stderr, "truth: model text too long\n");
        exit(1);
    }
}

/* n uniform rods hanging from the origin, hinges about -y at their upper ends, relative angles.
   Couplings by polynomials, or NULL, as stiff as MuJoCo allows: with the default solimp .9 .95 the error is 15 to 120 times
   larger. */
static void chain_xml(struct text *x, const char *name, int n, double length, double mass, double dt, const double (*poly)[4])
{
    double inertia = mass * length * length / 12;
    x->n = 0;
    append(x, "<mujoco model=\"%s\">\n<compiler angle=\"radian\"/>\n", name);
    append(x, "<option timestep=\"%g\" integrator=\"RK4\" solver=\"Newton\" gravity=\"0 0 -9.81\">", dt);
    append(x, "<flag energy=\"enable\"/></option>\n<worldbody>\n");
    for (int i = 0; i < n; i++) {
        append(x, "<body pos=\"0 0 %.17g\"><joint name=\"j%d\" type=\"hinge\" axis=\"0 -1 0\"/>", i ? -length : 0.0, i);
        append(x, "<inertial pos=\"0 0 %.17g\" mass=\"%.17g\" diaginertia=\"%.17g %.17g %.17g\"/>\n",
               -length / 2, mass, inertia, inertia, inertia / 100);
    }
    for (int i = 0; i < n; i++) append(x, "</body>");
    append(x, "\n</worldbody>\n");
    if (poly) {
        append(x, "<equality>\n");
        for (int i = 0; i < n; i++)
            if (i % 4)
                append(x, "<joint joint1=\"j%d\" joint2=\"j%d\" polycoef=\"0 %g %g %g %g\" solref=\"%g 1\"\n"
                       "  solimp=\".9999 .9999 .001\"/>\n", i, i - i % 4,
                       poly[i][0], poly[i][1], poly[i][2], poly[i][3], 2 * dt);
        append(x, "</equality>\n");
    }
    append(x, "</mujoco>\n");
}

/* MuJoCo centres a grid half a spacing off, hence the offset. The rope's frame is turned: its sliders are down, y, x.
   Equalities are off, so tendons are springs. As many constraints as the cloth has beads; without <size> some are dropped. */
static void grid_xml(struct text *x, enum truth_system system)
{
    static const char *const kinds[2] = {"main", "shear"};
    const struct grid *g = grid_of(system);
    const int falls = g == &cloth;
    x->n = 0;
    append(x, "<mujoco model=\"%s\">\n<size njmax=\"256\" nconmax=\"256\" nstack=\"2000000\"/>\n", specs[system].name);
    append(x, "<option timestep=\"%g\" integrator=\"%s\" solver=\"Newton\" gravity=\"0 0 -%g\">",
           specs[system].dt_sim, falls ? "Euler" : "RK4", GRAVITY);
    append(x, "<flag energy=\"enable\" equality=\"disable\"/></option>\n<worldbody>\n");
    if (falls)
        append(x, "<geom type=\"sphere\" size=\"%g\" contype=\"1\" conaffinity=\"0\" condim=\"1\" solref=\"0.02 1\"/>\n", SPHERE);
    append(x, falls ? "<body pos=\"0 0 %g\">\n" : "<body quat=\"1 0 1 0\">\n", SPHERE + BEAD + FALL);
    append(x, "<composite type=\"grid\" count=\"%d %d 1\" spacing=\"%g\" offset=\"%g %g 0\">\n", g->columns, g->rows, g->spacing,
           (g->pinned ? g->columns : 1) * g->spacing / 2, g->spacing / 2);
    append(x, "<joint kind=\"main\" damping=\"0\" armature=\"0\"/>\n");
    for (int i = 0; i < 2; i++)
        if (g->stiffness[i] > 0)
            append(x, "<tendon kind=\"%s\" stiffness=\"%g\" damping=\"%g\"/>\n", kinds[i], g->stiffness[i], g->damping[i]);
    append(x, "<geom type=\"sphere\" size=\"%g\" mass=\"%g\" contype=\"0\" conaffinity=\"%d\" condim=\"1\" solref=\"0.02 1\"/>\n",
           BEAD, g->mass, falls);
    if (g->pinned) append(x, "<pin coord=\"0\"/>\n");
    append(x, "</composite>\n</body>\n</worldbody>\n</mujoco>\n");
}

static void system_xml(enum truth_system system, struct text *x)
{
    static const double later[16][4];           /* those of wave16_soft: couple() */
    const double(*poly)[4] = system == TRUTH_PEND16_SOFT ? polynomial : system == TRUTH_WAVE16_SOFT ? later : NULL;
    const char *name = specs[system].name;
    double dt = specs[system].dt_sim;
    if (grid_of(system)) grid_xml(x, system);
    else if (specs[system].dof == 2) chain_xml(x, name, 2, 1, 1, dt, NULL);
    else chain_xml(x, name, 16, .125, .125, dt, poly);
}

static void on_error(const char *message)       /* MuJoCo goes on if this returns */
{
    fprintf(stderr, "MuJoCo error: %s\n", message);
    exit(1);
}

static void on_warning(const char *message)     /* counted in d->warning, see warned() */
{
    fprintf(stderr, "MuJoCo warning: %s\n", message);
}

struct rig {
    enum truth_system system;
    mjModel *m;
    mjData *d;
};

static int load(struct rig *rig, const char *xml)
{
    char error[500] = "";
    mjVFS *vfs = malloc(sizeof *vfs);           /* 2 MB */
    if (!vfs) return -1;
    mju_user_error = on_error;
    mju_user_warning = on_warning;
    mj_defaultVFS(vfs);
    mj_makeEmptyFileVFS(vfs, "model.xml", (int)strlen(xml));
    memcpy(vfs->filedata[0], xml, strlen(xml));
    rig->m = mj_loadXML("model.xml", vfs, error, sizeof error);
    mj_deleteVFS(vfs);
    free(vfs);
    rig->d = rig->m ? mj_makeData(rig->m) : NULL;
    if (error[0] || !rig->d) {
        fprintf(stderr, "truth: model: %s\n", error);
        return -1;
    }
    return 0;
}

static struct rig rigs[TRUTH_SYSTEMS];

static struct rig *rig_of(enum truth_system system)
{
    static struct text xml;
    struct rig *rig = &rigs[system];
    if (rig->d) return rig;
    rig->system = system;
    system_xml(system, &xml);
    return load(rig, xml.s) ? NULL : rig;
}

static int warning(const mjData *d)             /* its number, or -1: none */
{
    int i = 0;
    while (i < mjNWARNING && !d->warning[i].number) i++;
    return i < mjNWARNING ? i : -1;
}

static int warned(const mjData *d)
{
    int i = warning(d);
    if (i >= 0) fprintf(stderr, "truth: %s\n", mju_warningText(i, d->warning[i].lastinfo));
    return i >= 0;
}

/* ---- torques: on every driven joint a sum of sines, or a PD controller that follows one ---- */

struct drive {
    int joints, terms, step;                    /* joint j of the drive is joint step * j of the chain */
    double amplitude[4], frequency[4][3], phase[4][3];
    double kp[4], kd[4];                        /* 0: the sines are the torque; N m, N m s             */
};

/* pend2: tau_i = a_i sin(2 pi f t + p); a_0 ~ U(1, 4), a_1 ~ U(.3, 1) N m, f ~ U(.2, 2) Hz; gravity's moments reach
   19.6 and 4.9 N m.
   pend16: tau_u = a_j sum of 3 sines with f ~ U(.2, 3) Hz; a_j ~ U(.5, 1) * 2 % of gravity's largest moment about the joint.
   pend16_pd: the sines, a_j ~ U(.07, .2) rad, f ~ U(.1, 1.2) Hz, are followed with w ~ U(2, 8) rad/s, zeta ~ U(.2, .7). */
static struct drive draw_drive(enum truth_system system, uint64_t *state)
{
    static const double low2[2] = {1, .3}, high2[2] = {4, 1};
    static const double inertia[4] = {5, 2.2, .85, .25};   /* about the joint; the last is made stiffer */
    const int pd = system == TRUTH_PEND16_PD;
    const double w = pd ? uniform(state, 2, 8) : 0, zeta = pd ? uniform(state, .2, .7) : 0;
    struct drive v = {0, 0, 1, {0}, {{0}}, {{0}}, {0}, {0}};
    if (system == TRUTH_PEND2_ACT) v.joints = 2, v.terms = 1;
    if (system == TRUTH_PEND16_ACT || pd) v.joints = 4, v.terms = 3, v.step = 4;
    for (int j = 0; j < v.joints; j++) {
        double length = 2 - .5 * j, moment = 9.81 * length * length / 2;    /* 1 kg/m */
        v.amplitude[j] = v.joints == 2 ? uniform(state, low2[j], high2[j]) : uniform(state, .5, 1) * .02 * moment;
        if (pd) {
            v.amplitude[j] = uniform(state, .07, .2);
            v.kp[j] = w * w * inertia[j];
            v.kd[j] = 2 * zeta * w * inertia[j];
        }
        for (int k = 0; k < v.terms; k++) {
            v.frequency[j][k] = pd ? uniform(state, .1, 1.2) : uniform(state, .2, v.joints == 2 ? 2 : 3);
            v.phase[j][k] = uniform(state, 0, 2 * PI);
        }
    }
    return v;
}

/* x, xd: angles and rates of the driven joints. */
static void drive_torque(const struct drive *v, double t, const double *x, const double *xd, int dof, double *tau)
{
    memset(tau, 0, (size_t)dof * sizeof *tau);
    for (int j = 0; j < v->joints; j++) {
        double r = 0, rd = 0;
        for (int k = 0; k < v->terms; k++) {
            const double w = 2 * PI * v->frequency[j][k], p = w * t + v->phase[j][k];
            r += v->amplitude[j] * sin(p);
            rd += v->amplitude[j] * w * cos(p);
        }
        tau[v->step * j] = v->kp[j] > 0 ? v->kp[j] * (r - x[j]) + v->kd[j] * (rd - xd[j]) : r;
    }
}

/* ---- sets ---- */

const char *truth_split_name(enum truth_split split)
{
    static const char *const names[TRUTH_SPLITS] = {"train", "test", "tune"};
    return names[split];
}

const char *truth_name(enum truth_system system) { return specs[system].name; }
int truth_dof(enum truth_system system) { return specs[system].dof; }
int truth_samples(enum truth_system system) { return specs[system].samples; }

int truth_find(const char *name, enum truth_system *system)
{
    for (int i = 0; i < TRUTH_SYSTEMS; i++)
        if (!strcmp(name, specs[i].name)) {
            *system = (enum truth_system)i;
            return 0;
        }
    return -1;
}

int truth_alloc(struct truth_set *s, enum truth_system system, int count, int samples)
{
    static struct text xml;
    memset(s, 0, sizeof *s);
    if (count < 1 || samples < 1) {
        fprintf(stderr, "truth: empty set\n");
        return -1;
    }
    s->system = system;
    s->count = count;
    s->samples = samples;
    s->dof = specs[system].dof;
    s->latent = specs[system].latent;
    s->dt_sim = specs[system].dt_sim;
    s->dt = specs[system].stride * s->dt_sim;

    system_xml(system, &xml);
    s->model_xml = malloc(xml.n + 1);
    if (s->model_xml) memcpy(s->model_xml, xml.s, xml.n + 1);

    size_t rows = (size_t)count * (size_t)samples, dof = (size_t)s->dof, latent = (size_t)s->latent;
    double **scalars[] = {&s->t, &s->e_kin, &s->e_pot}, **vectors[] = {&s->q, &s->qd, &s->qdd, &s->tau, &s->tau_model};
    int ok = s->model_xml != NULL;
    for (int i = 0; i < 3; i++) ok &= (*scalars[i] = calloc(rows, sizeof(double))) != NULL;
    for (int i = 0; i < 5; i++) ok &= (*vectors[i] = calloc(rows * dof, sizeof(double))) != NULL;
    if (latent) {
        ok &= (s->z = calloc(rows * latent, sizeof(double))) != NULL;
        ok &= (s->zd = calloc(rows * latent, sizeof(double))) != NULL;
    }
    if (ok) return 0;
    fprintf(stderr, "truth: out of memory\n");
    truth_free(s);
    return -1;
}

void truth_free(struct truth_set *s)
{
    double *all[] = {s->t, s->e_kin, s->e_pot, s->q, s->qd, s->qdd, s->tau, s->tau_model, s->z, s->zd};
    for (size_t i = 0; i < sizeof all / sizeof *all; i++) free(all[i]);
    free(s->model_xml);
    memset(s, 0, sizeof *s);
}

static void put(double *array, size_t row, int n, const double *x)
{
    memcpy(array + row * (size_t)n, x, (size_t)n * sizeof *x);
}

/* The state in d, after its forward pass, becomes sample k of the trajectory that starts at row0. */
static void log_sample(struct truth_set *s, size_t row0, int k, const mjData *d, const double *qdd,
                       const double *tau, const double *tau_model)
{
    size_t row = row0 + (size_t)k;
    s->t[row] = k * s->dt;
    s->e_pot[row] = d->energy[0];
    s->e_kin[row] = d->energy[1];
    put(s->q, row, s->dof, d->qpos);
    put(s->qd, row, s->dof, d->qvel);
    put(s->qdd, row, s->dof, qdd);
    put(s->tau, row, s->dof, tau);
    put(s->tau_model, row, s->dof, tau_model);
}

/* ---- couplings: q = phi(z) ---- */

/* Joint i and its first two derivatives by x, the first joint of its block. */
static void joint_jet(enum truth_system system, int i, double x, double jet[3])
{
    if (is_wave(system)) {
        const double *w = wave[i], s = sin(w[2] * x), c = cos(w[2] * x), v = sin(w[4] * x), u = cos(w[4] * x), t = tanh(w[6] * x);
        jet[0] = w[0] * x + w[1] * s + w[3] * (1 - u) + w[5] * t;
        jet[1] = w[0] + w[1] * w[2] * c + w[3] * w[4] * v + w[5] * w[6] * (1 - t * t);
        jet[2] = -w[1] * w[2] * w[2] * s + w[3] * w[4] * w[4] * u - 2 * w[5] * w[6] * w[6] * t * (1 - t * t);
    } else {
        const double *a = polynomial[i];
        jet[0] = x * (a[0] + x * (a[1] + x * (a[2] + x * a[3])));
        jet[1] = a[0] + x * (2 * a[1] + x * (3 * a[2] + x * 4 * a[3]));
        jet[2] = 2 * a[1] + x * (6 * a[2] + x * 12 * a[3]);
    }
}

/* phi, phi' and phi'' of each joint with respect to its own block's z. */
static void phi_jet(enum truth_system system, const double z[4], double q[16], double d1[16], double d2[16])
{
    for (int i = 0; i < 16; i++) {
        double jet[3];
        joint_jet(system, i, z[i / 4], jet);
        q[i] = jet[0], d1[i] = jet[1], d2[i] = jet[2];
    }
}

void truth_phi(enum truth_system system, const double z[4], double q[16], double J[64])
{
    double d1[16], d2[16];
    phi_jet(system, z, q, d1, d2);
    if (J)
        for (int i = 0; i < 64; i++) J[i] = i / 4 / 4 == i % 4 ? d1[i / 4] : 0;
}

/* MuJoCo couples joints by polynomials of degree 4 only. Those of wave16_soft become, before every step, the ones through five
   points about the present x: of a step's .02 rad at most 4e-9 rad off. */
static void couple(const struct rig *rig)
{
    enum { NODES = 5 };
    const double apart = .02;
    for (int e = 0; e < rig->m->neq && is_wave(rig->system); e++) {
        const int i = rig->m->eq_obj1id[e];
        double *a = rig->m->eq_data + e * mjNEQDATA, x[NODES], c[NODES], jet[3];
        for (int k = 0; k < NODES; k++) {
            x[k] = rig->d->qpos[i - i % 4] + (k - NODES / 2) * apart;
            joint_jet(rig->system, i, x[k], jet);
            c[k] = jet[0];
        }
        for (int k = 1; k < NODES; k++)         /* Newton's divided differences .. */
            for (int j = NODES - 1; j >= k; j--) c[j] = (c[j] - c[j - 1]) / (x[j] - x[j - k]);
        mju_zero(a, NODES);
        for (int k = NODES - 1; k >= 0; k--) {  /* .. by powers */
            for (int j = NODES - 1; j > 0; j--) a[j] = a[j - 1] - x[k] * a[j];
            a[0] = c[k] - x[k] * a[0];
        }
    }
}

/* ---- MuJoCo's own integration: mj_forward, log, step; bitwise the same as mj_step ---- */

/* tau = applied + actuator + constraint + dampers; springs are in e_pot, nothing else here is passive. */
static void motion_force(const mjModel *m, const mjData *d, double *tau)
{
    for (int i = 0; i < m->nv; i++) tau[i] = d->qfrc_applied[i] + d->qfrc_actuator[i] + d->qfrc_constraint[i];
    for (int t = 0; t < m->ntendon; t++)
        for (int i = d->ten_J_rowadr[t]; i < d->ten_J_rowadr[t] + d->ten_J_rownnz[t]; i++)      /* sparse from 60 dof on */
            tau[d->ten_J_colind[i]] -= m->tendon_damping[t] * d->ten_velocity[t] * d->ten_J[i];
}

/* The cloth is stepped by Euler: h times the sum of tau over the steps of an interval is then exactly the impulse of tau in
   it, however hard a contact sets in, so tau_model can be the mean. Both Euler and RK4 close the equation to round-off and
   lose their order at contacts: after .25 s q is 6e-4 (Euler) and 3e-4 (RK4, four times the time) off RK4 with a quarter of
   the step; energy - work of tau at every step is 2e-3 and 1e-3 of the peak, half of it with half the step. */
static void run_mujoco(struct truth_set *s, size_t row0, const struct rig *rig, const double *q0, const struct drive *v)
{
    const mjModel *m = rig->m;
    mjData *d = rig->d;
    int stride = specs[s->system].stride;
    double tau[DOF_MAX];
    mj_resetData(m, d);
    put(d->qpos, 0, s->dof, q0);
    for (int k = 0; k < s->samples; k++) {
        double *mean = s->tau_model + (row0 + (size_t)k) * (size_t)s->dof;
        drive_torque(v, k * s->dt, d->qpos, d->qvel, s->dof, d->qfrc_applied);
        for (int i = 0; i < stride; i++) {
            mj_checkPos(m, d);
            mj_checkVel(m, d);
            couple(rig);
            mj_forward(m, d);
            mj_checkAcc(m, d);
            if (i == 0 || grid_of(s->system)) motion_force(m, d, tau);
            if (i == 0) log_sample(s, row0, k, d, d->qacc, tau, d->qfrc_applied);
            if (grid_of(s->system))
                for (int j = 0; j < s->dof; j++) mean[j] += tau[j] / stride;
            if (m->opt.integrator == mjINT_EULER) mj_Euler(m, d);
            else mj_RungeKutta(m, d, 4);
        }
    }
}

/* ---- exact coupling: MuJoCo supplies M and bias = c + dV/dq ---- */

static void project(const double d1[16], const double f[16], double out[4])     /* J^T f */
{
    for (int b = 0; b < 4; b++) {
        out[b] = 0;
        for (int i = 4 * b; i < 4 * b + 4; i++) out[b] += d1[i] * f[i];
    }
}

static void reduced_mass(const struct rig *rig, const double d1[16], double Mz[16])    /* J^T M J at d->qpos */
{
    for (int b = 0; b < 4; b++) {
        double column[16] = {0}, Mc[16];
        memcpy(column + 4 * b, d1 + 4 * b, 4 * sizeof *d1);
        mj_mulM(rig->m, rig->d, Mc, column);
        project(d1, Mc, Mz + 4 * b);
    }
}

static void solve4(double A[16], double x[4])       /* x := A^-1 x by Cholesky, A = L L^T */
{
    for (int j = 0; j < 4; j++)
        for (int i = j; i < 4; i++) {
            double sum = A[4 * i + j];
            for (int k = 0; k < j; k++) sum -= A[4 * i + k] * A[4 * j + k];
            A[4 * i + j] = i == j ? sqrt(sum) : sum / A[5 * j];
        }
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < i; k++) x[i] -= A[4 * i + k] * x[k];
        x[i] /= A[5 * i];
    }
    for (int i = 3; i >= 0; i--) {
        for (int k = i + 1; k < 4; k++) x[i] -= A[4 * k + i] * x[k];
        x[i] /= A[5 * i];
    }
}

/* (J^T M J) zdd = J^T (tau_u - bias - M Jd zd); leaves q, qd and bias in d and gives qdd = J zdd + Jd zd. */
static void reduced_forward(const struct rig *rig, const double z[4], const double zd[4], const double tau_u[16],
                            double zdd[4], double qdd[16])
{
    const mjModel *m = rig->m;
    mjData *d = rig->d;
    double d1[16], d2[16], Jdzd[16], f[16], Mz[16];
    phi_jet(rig->system, z, d->qpos, d1, d2);
    for (int i = 0; i < 16; i++) {
        d->qvel[i] = d1[i] * zd[i / 4];
        Jdzd[i] = d2[i] * zd[i / 4] * zd[i / 4];
    }
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    reduced_mass(rig, d1, Mz);
    mj_mulM(m, d, f, Jdzd);
    for (int i = 0; i < 16; i++) f[i] = tau_u[i] - d->qfrc_bias[i] - f[i];
    project(d1, f, zdd);
    solve4(Mz, zdd);
    for (int i = 0; i < 16; i++) qdd[i] = d1[i] * zdd[i / 4] + Jdzd[i];
}

/* One RK4 step of (z, zd); zdd1 is the acceleration at its start. */
static void reduced_step(const struct rig *rig, double h, const double tau_u[16], const double zdd1[4], double z[4], double zd[4])
{
    static const double c[3] = {.5, .5, 1};
    double k[4][4], v[4][4], x[4], qdd[16];         /* k: zd and v: zdd of the stages */
    memcpy(k[0], zd, sizeof k[0]);
    memcpy(v[0], zdd1, sizeof v[0]);
    for (int s = 0; s < 3; s++) {
        for (int b = 0; b < 4; b++) {
            x[b] = z[b] + c[s] * h * k[s][b];
            k[s + 1][b] = zd[b] + c[s] * h * v[s][b];
        }
        reduced_forward(rig, x, k[s + 1], tau_u, v[s + 1], qdd);
    }
    for (int b = 0; b < 4; b++) {
        z[b] += h / 6 * (k[0][b] + 2 * k[1][b] + 2 * k[2][b] + k[3][b]);
        zd[b] += h / 6 * (v[0][b] + 2 * v[1][b] + 2 * v[2][b] + v[3][b]);
    }
}

static void run_exact(struct truth_set *s, size_t row0, const struct rig *rig, const double z0[4], const struct drive *v)
{
    double z[4], zd[4] = {0}, zdd[4], qdd[16], tau[16], tau_u[16];
    memcpy(z, z0, sizeof z);
    mj_resetData(rig->m, rig->d);
    for (int k = 0; k < s->samples; k++) {
        drive_torque(v, k * s->dt, z, zd, 16, tau_u);
        reduced_forward(rig, z, zd, tau_u, zdd, qdd);
        mj_energyPos(rig->m, rig->d);
        mj_energyVel(rig->m, rig->d);
        mj_mulM(rig->m, rig->d, tau, qdd);
        for (int i = 0; i < 16; i++) tau[i] += rig->d->qfrc_bias[i];
        log_sample(s, row0, k, rig->d, qdd, tau, tau_u);
        put(s->z, row0 + (size_t)k, 4, z);
        put(s->zd, row0 + (size_t)k, 4, zd);
        mj_checkPos(rig->m, rig->d);
        mj_checkVel(rig->m, rig->d);
        reduced_step(rig, s->dt, tau_u, zdd, z, zd);
    }
}

/* ---- generation ---- */

/* The rope: straight, tilted from hanging, any azimuth. The cloth: flat, its centre beside the sphere's. */
static void start_grid(enum truth_system system, uint64_t *state, double *q)
{
    const struct grid *g = grid_of(system);
    double a = g->pinned ? uniform(state, .24, .8) : uniform(state, -.01, .01);
    double b = g->pinned ? uniform(state, 0, 2 * PI) : uniform(state, -.01, .01);
    double rope_shift[3] = {cos(a) - 1, sin(a) * sin(b), sin(a) * cos(b)}, cloth_shift[3] = {a, b, 0};
    for (int i = 0; i < specs[system].dof; i++)
        q[i] = g->pinned ? g->spacing * (i / 3 + 1) * rope_shift[i % 3] : cloth_shift[i % 3];
}

/* starts: as in truth_generate_from, or NULL. */
static int generate(struct truth_set *s, enum truth_system system, enum truth_split split, uint64_t seed, int first, int count,
                    int samples, const double *starts)
{
    const struct rig *rig = rig_of(system);
    if (!rig || truth_alloc(s, system, count, samples)) return -1;
    s->seed = seed;
    for (int n = 0; n < count; n++) {
        uint64_t state = stream(seed, split, first + n);
        double x[4] = {0}, q[DOF_MAX];
        int free_joints = grid_of(system) ? 0 : s->dof == 2 ? 2 : 4;
        for (int i = 0; i < free_joints; i++) {
            x[i] = s->dof == 2 ? uniform(&state, -PI / 2, PI / 2) : uniform(&state, -.5, .5);
            if (system == TRUTH_PEND16_NARROW) x[i] *= .6;
            if (starts) x[i] = starts[n * s->dof + i * (s->dof / free_joints)];
        }
        struct drive v = draw_drive(system, &state);

        size_t row0 = (size_t)n * (size_t)samples;
        if (s->latent) run_exact(s, row0, rig, x, &v);
        else if (s->dof == 2) run_mujoco(s, row0, rig, x, &v);
        else {
            if (grid_of(system)) start_grid(system, &state, q);
            else truth_phi(system, x, q, NULL);
            run_mujoco(s, row0, rig, q, &v);
        }
        if (warned(rig->d)) {
            truth_free(s);
            return -1;
        }
    }
    return 0;
}

int truth_generate(struct truth_set *s, enum truth_system system, enum truth_split split, uint64_t seed, int first, int count,
                   int samples)
{
    return generate(s, system, split, seed, first, count, samples, NULL);
}

int truth_generate_from(struct truth_set *s, enum truth_system system, uint64_t seed, int count, int samples, const double *starts)
{
    return generate(s, system, TRUTH_TRAIN, seed, 0, count, samples, starts);
}

/* ---- grids ---- */

int truth_grid(enum truth_system system, int *columns, int *rows)
{
    const struct grid *g = grid_of(system);
    if (!g) return -1;
    *columns = g->columns;
    *rows = g->rows;
    return 0;
}

int truth_beads(enum truth_system system, const double *q, double *xyz)
{
    const struct grid *g = grid_of(system);
    if (!g) return -1;
    for (int b = 0; b < g->columns * g->rows; b++) {
        double *x = xyz + 3 * b;
        if (g->pinned) {
            static const double still[3] = {0, 0, 0};
            const double *s = b ? q + 3 * (b - 1) : still;
            x[0] = s[2];
            x[1] = s[1];
            x[2] = -b * g->spacing - s[0];
        } else {
            x[0] = (b / g->rows - .5 * (g->columns - 1)) * g->spacing + q[3 * b];
            x[1] = (b % g->rows - .5 * (g->rows - 1)) * g->spacing + q[3 * b + 1];
            x[2] = SPHERE + BEAD + FALL + q[3 * b + 2];
        }
    }
    return 0;
}

/* ---- what a set must satisfy ---- */

static double larger(double a, double b) { return a >= fabs(b) || a != a ? a : fabs(b); }     /* keeps NaN */

/* q, qd, qdd are in d; f = M qdd + c + dV/dq. Returns max |M qdd + c - passive - constraint| of the grids, where MuJoCo's inverse
   dynamics take the contact forces from qdd, not from the solver; other systems: 0. */
static double motion(const struct rig *rig, int is_grid, double *f)
{
    const mjModel *m = rig->m;
    mjData *d = rig->d;
    double worst = 0;
    if (is_grid) mj_inverse(m, d);
    else {
        mj_fwdPosition(m, d);
        mj_fwdVelocity(m, d);
    }
    mj_rne(m, d, 1, f);
    for (int t = 0; t < m->ntendon; t++)
        for (int i = d->ten_J_rowadr[t]; i < d->ten_J_rowadr[t] + d->ten_J_rownnz[t]; i++)
            f[d->ten_J_colind[i]] += m->tendon_stiffness[t] * (d->ten_length[t] - m->tendon_lengthspring[t]) * d->ten_J[i];
    for (int i = 0; i < m->nv && is_grid; i++) worst = larger(worst, d->qfrc_inverse[i]);
    return worst;
}

/* Springs and dampers cannot change the momentum of a free grid: what do tau_model and gravity leave of it? */
static double impulse_error(const struct truth_set *s, size_t row)      /* from row to row + 1 */
{
    const struct grid *g = grid_of(s->system);
    const size_t n = (size_t)s->dof;
    const double *v = s->qd + row * n, *u = s->tau_model + row * n;
    double p[3] = {0}, worst = 0;
    for (size_t i = 0; i < n; i++) p[i % 3] += g->mass * (v[n + i] - v[i] + (i % 3 == 2) * s->dt * GRAVITY) - s->dt * u[i];
    for (int i = 0; i < 3; i++) worst = larger(worst, p[i]);
    return worst;
}

int truth_check(const struct truth_set *s, struct truth_report *r)
{
    const struct rig *rig = rig_of(s->system);
    const struct grid *g = grid_of(s->system);
    size_t n = (size_t)s->dof;
    if (!rig) return -1;
    memset(r, 0, sizeof *r);
    mj_resetData(rig->m, rig->d);
    for (int j = 0; j < s->count; j++) {
        double drift = 0, peak = 0, work = 0;
        size_t row0 = (size_t)j * (size_t)s->samples;
        for (size_t row = row0; row < row0 + (size_t)s->samples; row++) {
            const double *q = s->q + row * n, *qd = s->qd + row * n, *tau = s->tau + row * n, *u = s->tau_model + row * n;
            double f[DOF_MAX], z[4], d1[16], d2[16];
            put(rig->d->qpos, 0, s->dof, q);
            put(rig->d->qvel, 0, s->dof, qd);
            put(rig->d->qacc, 0, s->dof, s->qdd + row * n);
            r->residual = larger(r->residual, motion(rig, g != NULL, f));
            if (g && !g->pinned && row > row0) r->impulse = larger(r->impulse, impulse_error(s, row - 1));
            for (size_t i = 0; i < n; i++) {
                r->residual = larger(r->residual, f[i] - tau[i]);
                r->force_max = larger(r->force_max, tau[i]);
                r->q_max = larger(r->q_max, q[i]);
                r->qd_max = larger(r->qd_max, qd[i]);
                if (row > row0) work += s->tau_model[(row - 1) * n + i] * (q[i] - s->q[(row - 1) * n + i]);
                f[i] = tau[i] - u[i];
            }
            if (s->latent) {
                phi_jet(s->system, s->z + 4 * row, rig->d->qpos, d1, d2);
                project(d1, f, z);
                for (int i = 0; i < 4; i++) r->ideal = larger(r->ideal, z[i]);
            }
            peak = larger(peak, s->e_kin[row]);
            drift = larger(drift, s->e_kin[row] + s->e_pot[row] - s->e_kin[row0] - s->e_pot[row0] - work);
        }
        r->energy = larger(r->energy, drift / peak);
    }
    return warned(rig->d) ? -1 : 0;
}

int truth_csv(const struct truth_set *s, const char *path)
{
    const double *columns[] = {s->q, s->qd, s->tau_model};
    static const char *const names[] = {"q", "qd", "tau"};
    FILE *f = fopen(path, "w");
    if (!f) {
        perror(path);
        return -1;
    }
    fputs("t", f);
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < s->dof; i++) fprintf(f, ",%s%d", names[c], i);
    fputc('\n', f);
    for (size_t row = 0; row < (size_t)s->count * (size_t)s->samples; row++) {
        if (row && row % (size_t)s->samples == 0) fputc('\n', f);
        fprintf(f, "%.9g", s->t[row]);
        for (int c = 0; c < 3; c++)
            for (size_t i = 0; i < (size_t)s->dof; i++) fprintf(f, ",%.9g", columns[c][row * (size_t)s->dof + i]);
        fputc('\n', f);
    }
    int bad = ferror(f);
    if (fclose(f) || bad) {
        perror(path);
        return -1;
    }
    return 0;
}

/* ---- true mass matrices and potential ---- */

int truth_terms_pend2(const double q[2], const double qd[2], double M[4], double c[2], double g[2])
{
    const struct rig *rig = rig_of(TRUTH_PEND2);
    if (!rig) return -1;
    put(rig->d->qpos, 0, 2, q);
    mju_zero(rig->d->qvel, 2);
    mj_fwdPosition(rig->m, rig->d);
    mj_fwdVelocity(rig->m, rig->d);
    mj_fullM(rig->m, M, rig->d->qM);
    put(g, 0, 2, rig->d->qfrc_bias);
    put(rig->d->qvel, 0, 2, qd);
    mj_fwdVelocity(rig->m, rig->d);
    mju_sub(c, rig->d->qfrc_bias, g, 2);
    return 0;
}

int truth_energy(enum truth_system system, const double *q, const double *qd, double *T, double *V)
{
    const struct rig *rig = rig_of(system);
    if (!rig) return -1;
    put(rig->d->qpos, 0, specs[system].dof, q);
    put(rig->d->qvel, 0, specs[system].dof, qd);
    mj_fwdPosition(rig->m, rig->d);
    mj_energyPos(rig->m, rig->d);
    mj_energyVel(rig->m, rig->d);
    *V = rig->d->energy[0], *T = rig->d->energy[1];
    return 0;
}

int truth_reduced(enum truth_system system, const double z[4], double M[16], double *V)
{
    const struct rig *rig = specs[system].dof == 16 ? rig_of(system) : NULL;
    double d1[16], d2[16];
    if (!rig) {
        fprintf(stderr, "truth: %s: no reduced mass\n", specs[system].name);
        return -1;
    }
    phi_jet(system, z, rig->d->qpos, d1, d2);
    mj_fwdPosition(rig->m, rig->d);
    mj_energyPos(rig->m, rig->d);
    reduced_mass(rig, d1, M);
    *V = rig->d->energy[0];
    return 0;
}

/* ---- other time steps ---- */

static void on_expected_warning(const char *message)
{
    (void)message;
}

static void start_at(const struct truth_set *s, const struct rig *rig, size_t row)
{
    mj_resetData(rig->m, rig->d);
    put(rig->d->qpos, 0, s->dof, s->q + row * (size_t)s->dof);
    put(rig->d->qvel, 0, s->dof, s->qd + row * (size_t)s->dof);
}

static double step_error(const struct truth_set *s, const struct rig *rig, const double *mean)
{
    const double dt = rig->m->opt.timestep;
    const size_t n = (size_t)s->dof, samples = (size_t)s->samples;
    double off = 0, var = 0;
    for (size_t row = 0; row < (size_t)s->count * samples; row += samples) {
        const long steps = (long)((s->samples - 1) * s->dt / dt + 1e-6);
        start_at(s, rig, row);
        for (long k = 1; k <= steps; k++) {
            const double at = (double)k * dt / s->dt, nearest = floor(at + .5);
            const double *q = s->q + (row + (size_t)nearest) * n;
            couple(rig);
            mj_step(rig->m, rig->d);
            if (warning(rig->d) >= 0) return HUGE_VAL;
            if (fabs(at - nearest) > 1e-6) continue;
            for (size_t i = 0; i < n; i++) {
                off += (rig->d->qpos[i] - q[i]) * (rig->d->qpos[i] - q[i]);
                var += (q[i] - mean[i]) * (q[i] - mean[i]);
            }
        }
    }
    return sqrt(off / var);
}

/* In pieces of 50 steps, the least time of each: other processes disturb a piece more rarely than a trajectory. */
static double step_time(const struct truth_set *s, const struct rig *rig)
{
    enum { RUNS = 15, STEPS = 3000, PIECE = 50, PIECES = 1000 };    /* at least so many runs and steps */
    const int all = (int)((s->samples - 1) * s->dt / rig->m->opt.timestep + 1e-6);
    const int steps = all < PIECES * PIECE ? all : PIECES * PIECE;
    double least[PIECES], sum = 0;
    for (int run = 0; run < RUNS || run * steps < STEPS; run++) {
        start_at(s, rig, 0);
        for (int k = 0; k < steps; k += PIECE) {
            struct timespec a, b;
            double us;
            clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &a);
            for (int i = k; i < steps && i < k + PIECE; i++) {
                couple(rig);
                mj_step(rig->m, rig->d);
            }
            clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &b);
            us = 1e6 * (double)(b.tv_sec - a.tv_sec) + 1e-3 * (double)(b.tv_nsec - a.tv_nsec);
            if (run == 0 || us < least[k / PIECE]) least[k / PIECE] = us;
        }
    }
    for (int k = 0; k < steps; k += PIECE) sum += least[k / PIECE];
    return sum / steps;
}

int truth_time(const struct truth_set *s, double dt, double *us_per_step, double *error)
{
    const struct rig *rig = rig_of(s->system);
    const size_t rows = (size_t)s->count * (size_t)s->samples, n = (size_t)s->dof;
    double mean[DOF_MAX] = {0};
    if (!rig || s->latent || s->system == TRUTH_PEND2_ACT || dt > (s->samples - 1) * s->dt) {
        fprintf(stderr, "truth: %s: not stepped by %g s\n", specs[s->system].name, dt);
        return -1;
    }
    for (size_t i = 0; i < rows * n; i++) mean[i % n] += s->q[i] / (double)rows;
    const mjOption own = rig->m->opt;
    rig->m->opt.timestep = dt;
    rig->m->opt.enableflags &= ~mjENBL_ENERGY;
    mju_user_warning = on_expected_warning;
    *error = step_error(s, rig, mean);
    if (us_per_step && *error < HUGE_VAL) *us_per_step = step_time(s, rig);
    mju_user_warning = on_warning;
    rig->m->opt = own;
    mj_resetData(rig->m, rig->d);
    return *error < HUGE_VAL ? 0 : 1;
}

/* ---- a plant for closed loops ---- */

struct truth_plant {
    const struct rig *rig;                      /* its d is scratch here */
    mjData *d;
};

int truth_plant_open(struct truth_plant **p, const double q[16], const double qd[16])
{
    const struct rig *rig = rig_of(TRUTH_PEND16_SOFT);
    *p = rig ? malloc(sizeof **p) : NULL;
    if (!*p) return -1;
    (*p)->rig = rig;
    (*p)->d = mj_makeData(rig->m);
    if (!(*p)->d) {
        fprintf(stderr, "truth: out of memory\n");
        free(*p);
        *p = NULL;
        return -1;
    }
    put((*p)->d->qpos, 0, 16, q);
    put((*p)->d->qvel, 0, 16, qd);
    return 0;
}

int truth_plant_step(struct truth_plant *p, const double tau[16])
{
    put(p->d->qfrc_applied, 0, 16, tau);
    mj_step(p->rig->m, p->d);
    return warned(p->d) ? -1 : 0;
}

void truth_plant_state(const struct truth_plant *p, double q[16], double qd[16])
{
    put(q, 0, 16, p->d->qpos);
    put(qd, 0, 16, p->d->qvel);
}

void truth_plant_gravity(const struct truth_plant *p, double g[16])
{
    const mjModel *m = p->rig->m;
    mjData *d = p->rig->d;
    put(d->qpos, 0, 16, p->d->qpos);
    mju_zero(d->qvel, m->nv);
    mj_fwdPosition(m, d);
    mj_fwdVelocity(m, d);
    put(g, 0, 16, d->qfrc_bias);
}

void truth_plant_close(struct truth_plant *p)
{
    if (p) mj_deleteData(p->d);
    free(p);
}
