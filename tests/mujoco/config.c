/* SPDX-License-Identifier: MIT */
/* config.c - what record.c writes beside the recordings: the config that is proposed, the motion at constant velocity, names. */
#include <ctype.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "machine.h"

enum { LATENT = 12 }; /* coordinates of a proposed model, at most */

/* ---- the config ---- */

/* Rank of the equality constraints where d is, and of tendons that are taut at rest: Gram-Schmidt with the largest row left. */
static int rank_of_equalities(void)
{
    const int N = rig.m->nv, all = rig.d->nefc;
    double *J = room((size_t)(all * N) * sizeof *J), first = 0;
    int rank = 0, ne = 0;
    for (int i = 0; i < all; i++)
        if (rig.d->efc_type[i] == mjCNSTR_EQUALITY || (rig.taut > 0 && rig.d->efc_type[i] == mjCNSTR_LIMIT_TENDON))
            memcpy(J + ne++ * N, rig.d->efc_J + i * N, (size_t)N * sizeof *J);
    for (; rank < ne && rank < N; rank++) {
        double best = 0;
        int at = 0;
        for (int i = 0; i < ne; i++) {
            const double x = mju_dot(J + i * N, J + i * N, N);
            if (x > best) best = x, at = i;
        }
        if (rank == 0) first = best;
        if (best <= 1e-12 * first || best == 0) break;
        double *r = room((size_t)N * sizeof *r);
        mju_scl(r, J + at * N, 1 / sqrt(best), N);
        for (int i = 0; i < ne; i++)
            mju_addToScl(J + i * N, r, -mju_dot(J + i * N, r, N), N);
        free(r);
    }
    free(J);
    return rank;
}

/* The mean pose of the training, and with C the sum of (q - mean)(q - mean)^T of every tenth sample; returns its trace. */
static double moments(const demos *d, double *mean, double *C)
{
    const int N = d->N, wide = demos_wide(d);
    double *x = room((size_t)N * sizeof *x), trace = 0;
    int count = 0;
    for (int pass = 0; pass < 2; pass++) {
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s < d->demo[k].samples && !d->demo[k].test; s += 10) {
                const double *q = d->demo[k].row + s * wide + 1;
                if (pass == 0) mju_addTo(mean, q, N), count++;
                else mju_sub(x, q, mean, N);
                for (int i = 0; i < N && C && pass == 1; i++)
                    mju_addToScl(C + i * N, x, x[i], N);
            }
        if (pass == 0) mju_scl(mean, mean, 1.0 / (count > 0 ? count : 1), N);
    }
    for (int i = 0; i < N && C; i++)
        trace += C[i * (N + 1)];
    free(x);
    return trace;
}

/* Hinges and sliders: each joint has a unit of its own (ROLN_SCALE each). */
static int mixed(void)
{
    int hinges = 0;
    for (int j = 0; j < rig.m->njnt; j++)
        hinges += hinge(j);
    return hinges > 0 && hinges < rig.m->njnt;
}

/* These units: rms over the training, 1 of joints at rest and, where a model has angles, of those; all 1 where joints are of one
   kind. */
static void units(const demos *d, const double *mean, int angles, double *unit)
{
    const int wide = demos_wide(d);
    for (int i = 0; i < d->N; i++) {
        double square = 0;
        int count = 0;
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s < d->demo[k].samples && !d->demo[k].test; s++, count++) {
                const double x = d->demo[k].row[s * wide + 1 + i] - mean[i];
                square += x * x;
            }
        unit[i] = mixed() && square > 0 && !(angles && rig.angle[i]) ? sqrt(square / count) : 1;
    }
}

/* Coordinates with which linear POD leaves less than `leave` of the motion, at most LATENT: power iteration. */
static int principal(const demos *d, double leave)
{
    const int N = d->N;
    double *mean = room((size_t)N * sizeof *mean), *C = room((size_t)(N * N) * sizeof *C), *x = room((size_t)(2 * N) * sizeof *x);
    double all = moments(d, mean, C), left;
    int n = 0;
    if (mixed()) {
        units(d, mean, 0, x);
        all = 0;
        for (int i = 0; i < N * N; i++)
            C[i] /= x[i / N] * x[i % N];
        for (int i = 0; i < N; i++)
            all += C[i * (N + 1)];
    }
    left = all;
    for (; n < LATENT && n < N && left > leave * leave * all; n++) {
        double *y = x + N, value = 0;
        for (int i = 0; i < N; i++)
            x[i] = 1 + 0.1 * (i % 7);
        for (int k = 0; k < 200; k++) {
            mju_mulMatVec(y, C, x, N, N);
            value = mju_norm(y, N);
            mju_scl(x, y, 1 / (value + 1e-300), N);
        }
        for (int i = 0; i < N; i++)
            mju_addToScl(C + i * N, x, -value * x[i], N);
        left -= value;
    }
    free(mean), free(C), free(x);
    return n;
}

/* Monomials of n coordinates from degree 0 to d. */
static double monomials(int n, int d)
{
    double x = 1;
    for (int k = 1; k <= d; k++)
        x *= (double)(n + k) / k;
    return x;
}

shape propose(const demos *d)
{
    const int N = d->N;
    double samples = 0;
    shape s = {N, 0, 0};
    for (int k = 0; k < d->count; k++)
        samples += d->demo[k].samples;
    if (rig.taut > 0) find_strings();
    else mj_resetData(rig.m, rig.d);
    mj_forward(rig.m, rig.d);
    s.equalities = rank_of_equalities();
    if (s.equalities > 0 && s.equalities < N) s.n = N - s.equalities;
    if (s.n > 8) {
        const int n = principal(d, 0.02);
        if (n > 0 && n <= s.n / 2) s.n = n;
    }
    if (s.n == N) return s;
    s.degree = s.n <= 4 ? 4 : s.n <= 10 ? 3 : 2;
    while (s.degree > 2 && monomials(s.n, s.degree) > samples / 10)
        s.degree--;
    return s;
}

/* Does anything take energy away? */
static int damped(void)
{
    const mjModel *m = rig.m;
    int is = m->opt.density > 0 || m->opt.viscosity > 0;
    for (int i = 0; i < m->nv; i++)
        is |= m->dof_damping[i] > 0;
    for (int t = 0; t < m->ntendon; t++)
        is |= m->tendon_damping[t] > 0 || m->tendon_frictionloss[t] > 0;
    return is;
}

static int rubbing(void)
{
    int is = 0;
    for (int i = 0; i < rig.m->nv; i++)
        is |= rig.m->dof_frictionloss[i] > 0;
    return is;
}

int drags(void)
{
    return rig.m->opt.density > 0;
}

/* Joints that a config sees as angles. */
static int sees_angle(int j, int all_hinges)
{
    return all_hinges ? periodic(j) : rig.angle[j];
}

static void write_comment(FILE *f, const char *name, const char *model, const shape *s)
{
    const mjModel *m = rig.m;
    fprintf(f, "/* %s.h - proposed by tests/mujoco/record.c for %s: %d joints, %d motors, %d equalities; samples of %g s", name,
            model, m->nv, m->nu, s->equalities, rig.dt);
    for (int j = 0, first = 1; j < m->njnt && rig.turns > 0; j++)
        if (rig.angle[j]) fprintf(f, "%s%d", first ? ";\n   joints that turn round: " : ", ", j + 1), first = 0;
    if (rubbing()) fprintf(f, ";\n   dry friction");
    for (int j = 0, first = 1; j < m->njnt && mixed(); j++)
        if (!hinge(j)) fprintf(f, "%s%d", first ? ";\n   sliders: " : ",", j + 1), first = 0;
    if (drags()) fprintf(f, ";\n   drag that grows with the square of the speed");
    if (rig.untouched) fprintf(f, ";\n   recorded without contacts");
    if (rig.taut > 0) fprintf(f, ";\n   recorded with %d taut tendons", rig.taut);
    for (int i = 0; i < m->nu * m->nv && m->nu < m->nv; i++) {
        if (i == 0) fprintf(f, ";\n   B of the motors [%d][%d] in the pose that the model begins in: ", m->nv, m->nu);
        fprintf(f, "%s%.6g", i == 0 ? "" : i % 12 ? ", " : ",\n   ", rig.moment[i % m->nu * m->nv + i / m->nu]);
    }
    fprintf(f, " */\n");
}

void write_config(const char *name, const char *path, const char *model, const shape *s, int which)
{
    const mjModel *m = rig.m;
    const int n = which == FULL ? m->nv : s->n, angles = n == m->nv && (rig.turns > 0 || which == ANGLES);
    FILE *f = fopen(path, "w");
    if (!f) refuse_place(path);
    write_comment(f, name, model, s);
    fprintf(f, "#ifndef %s_h\n#define %s_h\n\n#define ROLN_NAME %s\n#define ROLN_AE %d", name, name, name, m->nv);
    if (n < m->nv) fprintf(f, ", %d\n#define ROLN_CHART polynomial, %d", n, s->degree);
    fprintf(f, "\n#define ROLN_MLP 16, 16\n");
    for (int j = 0; j < m->njnt && angles; j++)
        fprintf(f, "%s%d", j ? ", " : "#define ROLN_ANGLES ", sees_angle(j, which == ANGLES));
    if (angles) fputc('\n', f);
    if (mixed()) fprintf(f, "#define ROLN_SCALE each\n");
    if (damped()) fprintf(f, "#define ROLN_DAMPING %d\n", drags() ? 2 : 1);
    if (rubbing()) fprintf(f, "#define ROLN_FRICTION 1\n");
    fprintf(f, "#define ROLN_HORIZON 25\n#include \"roln.h\"\n\n#endif\n");
    if (fclose(f)) refuse_place(path);
}

int more_angles(const shape *s)
{
    int more = 0;
    for (int j = 0; j < rig.m->njnt; j++)
        more |= periodic(j) && !(rig.turns > 0 && rig.angle[j]);
    return s->n == rig.m->nv && more;
}

/* ---- q + h qd ---- */

/* q - to of joint i; of an angle that a model knows for one, the shorter way. */
static double between(int i, double q, double to)
{
    return rig.angle[i] ? remainder(q - to, 2 * PI) : q - to;
}

/* Of those angles the mean of the training is that of their directions. */
static void mean_directions(const demos *d, double *mean)
{
    const int wide = demos_wide(d);
    for (int i = 0; i < d->N; i++) {
        double s = 0, c = 0;
        for (int k = 0; k < d->count; k++)
            for (int j = 0; j < d->demo[k].samples && !d->demo[k].test; j++) {
                const double q = d->demo[k].row[j * wide + 1 + i];
                s += sin(q), c += cos(q);
            }
        if (rig.angle[i]) mean[i] = atan2(s, c);
    }
}

void write_constant(const demos *d, const char *path)
{
    static const double ms[] = {0, 1, 5, 25, 100, 250, 500, 1000, 2000, 2995};
    const int N = d->N, wide = demos_wide(d), apart = (int)(0.025 / d->dt + 1e-6), every = apart > 1 ? apart : 1;
    double *mean = room((size_t)(2 * N) * sizeof *mean), *unit = mean + N;
    FILE *f = fopen(path, "w");
    if (!f) refuse_place(path);
    moments(d, mean, NULL);
    mean_directions(d, mean);
    units(d, mean, rig.turns > 0, unit);
    fprintf(f, "ms,E_q_percent\n");
    for (int h = 0, before = -1; h < 10; h++) {
        const int ahead = (int)(ms[h] * 1e-3 / d->dt + 0.5);
        double off = 0, var = 0;
        if (ahead == before) continue;
        before = ahead;
        for (int k = 0; k < d->count; k++)
            for (int s = 0; s + ahead < d->demo[k].samples && d->demo[k].test; s += every) {
                const double *q = d->demo[k].row + s * wide + 1, *end = q + ahead * wide;
                for (int i = 0; i < N; i++) {
                    const double e = between(i, q[i] + ahead * d->dt * q[N + i], end[i]), v = between(i, end[i], mean[i]);
                    off += e * e / (unit[i] * unit[i]), var += v * v / (unit[i] * unit[i]);
                }
            }
        if (var > 0) fprintf(f, "%g,%.5g\n", 1e3 * ahead * d->dt, 100 * sqrt(off / var));
    }
    free(mean);
    if (fclose(f)) refuse_place(path);
}

/* ---- names ---- */

/* Headers that a config cannot be called after, and ends of files that belong to another name. */
static const char *const taken[] = {"roln",   "roln_ae", "roln_lnn", "roln_riem", "roln_spd", "recording", "report",
                                    "assert", "complex", "ctype",    "errno",     "fenv",     "float",     "inttypes",
                                    "iso646", "limits",  "locale",   "math",      "pthread",  "setjmp",    "signal",
                                    "stdarg", "stdbool", "stddef",   "stdint",    "stdio",    "stdlib",    "string",
                                    "tgmath", "time",    "unistd",   "wchar",     "wctype"};
static const char *const ends_taken[] = {"_full", "_angles", "_test", "_constant", "_weights", "_errors", "_motion"};

/* Nonzero, and `of` the model that path was proposed for, if path is a config that this program wrote. */
static int config_of(const char *path, char of[4096])
{
    char line[5000] = "", *from, *end;
    FILE *f = fopen(path, "r");
    if (!f) return 0;
    if (!fgets(line, sizeof line, f)) *line = 0;
    fclose(f);
    if (!(from = strstr(line, "record.c for ")) || !(end = strstr(from, ": "))) return 0;
    *end = 0;
    snprintf(of, 4096, "%s", from + 13);
    return 1;
}

void map_out(const char *out, const char *model, char to[4096])
{
    const char *slash = strrchr(out, '/'), *base = slash ? slash + 1 : out;
    char name[100] = "", of[4096], path[4200];
    int n = 0, clash = 0;
    if (!*base || strlen(base) > 80) fail("OUT %s: its end is no file name of 1 to 80 letters\nhint: build/my, say", out);
    if (base - out > 3900) fail("OUT has more than 3900 letters\nhint: a shorter path");
    if (isdigit((unsigned char)*base)) n = snprintf(name, sizeof name, "m");
    for (; *base; base++)
        name[n++] = isalnum((unsigned char)*base) ? *base : '_';
    for (size_t i = 0; i < sizeof taken / sizeof *taken; i++)
        clash |= strcmp(name, taken[i]) == 0;
    for (size_t i = 0; i < sizeof ends_taken / sizeof *ends_taken; i++) {
        const size_t end = strlen(ends_taken[i]);
        clash |= strlen(name) >= end && strcmp(name + strlen(name) - end, ends_taken[i]) == 0;
    }
    if (clash) strcat(name, "_model");
    n = (int)(slash ? slash + 1 - out : 0);
    snprintf(to, 4096, "%.*s%s", n, out, name);
    for (int k = 2; model; k++) {
        snprintf(path, sizeof path, "%s.h", to);
        if (!config_of(path, of) || strcmp(of, model) == 0) break;
        snprintf(to, 4096, "%.*s%s_%d", n, out, name, k);
    }
}
