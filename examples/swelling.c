/* SPDX-License-Identifier: MIT */
/* swelling.c - why one interpolates covariances, inertias or diffusion tensors along their own geometry: two SPD matrices
   of determinant 1, one turned against the other, and four ways from one to the other. Prints the determinant along
   each and draws the ellipses x^T X^-1 x = 1; their area is pi sqrt(det X).

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/swelling.c -o swelling -lm
   ./swelling [picture.svg] */

#include "roln_spd.h"
#include <stdio.h>

enum { n = 2, nn = n * n, STEPS = 9 };
static const char *name[4] = {"Euclidean", "Cholesky", "log-Euclidean", "affine-invariant"};

/* Y = diag(4, 1/4) turned by the angle whose cosine and sine are c, s. */
static void turned(roln_real c, roln_real s, roln_real *Y)
{
    const roln_real Q[nn] = {c, s, -s, c}, l[n] = {4, ROLN_C(0.25)};
    roln_real work[ROLN_SPD_FORM_WORK(n)];
    roln_spd_form(n, l, Q, Y, work);
}

/* Y = the matrix at t on the way from P to X. */
static roln_status between(int way, roln_real t, const roln_real *P, const roln_real *X, roln_real *Y)
{
    roln_real a[nn], b[nn], work[ROLN_SPD_MAP_WORK(n)];
    roln_chol(n, P, a);
    if (way == 3) return roln_spd_map(n, ROLN_POWER, t, a, X, Y, work); /* A (A^-1 X A^-T)^t A^T */
    if (way == 0) memcpy(a, P, sizeof a), memcpy(b, X, sizeof b);
    if (way == 1) roln_chol(n, X, b);
    if (way == 2) roln_spd_map(n, ROLN_LOG, 0, NULL, P, a, work), roln_spd_map(n, ROLN_LOG, 0, NULL, X, b, work);
    for (int i = 0; i < nn; i++)
        Y[i] = (1 - t) * a[i] + t * b[i];
    if (way == 2) return roln_spd_map(n, ROLN_EXP, 0, NULL, Y, Y, work);
    if (way == 1) memcpy(a, Y, sizeof a), roln_mm_bt(n, n, n, a, a, Y);
    return ROLN_OK;
}

int main(int argc, char **argv)
{
    FILE *f = fopen(argc > 1 ? argv[1] : "swelling.svg", "w");
    roln_real P[nn], X[nn], Y[nn], l[n], Q[nn], work[ROLN_EIG_WORK(n)];
    if (!f) return 1;
    turned(ROLN_C(0.9659258), ROLN_C(0.2588190), P);  /* 15 degrees */
    turned(ROLN_C(-0.1736482), ROLN_C(0.9848078), X); /* 100 degrees */
    fprintf(f, "<svg xmlns='http://www.w3.org/2000/svg' width='900' height='478' viewBox='0 0 900 478' font-family='Helvetica, "
               "Arial, sans-serif' font-size='12' fill='#222'>\n<rect width='900' height='478' fill='#fff'/>\n<text x='24' y='32' "
               "font-size='16'>Four ways from one matrix to another of the same determinant: two swell, two do not</text>\n");
    printf("%-18s determinant at t = 0, 1/8 .. 1\n", "");
    for (int way = 0; way < 4; way++) {
        const int y = 92 + 104 * way, swells = way < 2;
        printf("%-18s", name[way]);
        fprintf(f, "<text x='24' y='%d' font-weight='bold'>%s</text>\n<g fill='%s' stroke='%s' stroke-width='1.4'>\n", y + 4,
                name[way], swells ? "#fdd0a2" : "#c6dbef", swells ? "#d94801" : "#08519c");
        for (int k = 0; k < STEPS; k++) {
            const int x = 180 + 84 * k;
            if (between(way, (roln_real)k / (STEPS - 1), P, X, Y) != ROLN_OK || roln_eig(n, Y, l, Q, work) != ROLN_OK) return 1;
            printf(" %5.3f", (double)(l[0] * l[1]));
            fprintf(f, "<ellipse rx='%.2f' ry='%.2f' transform='translate(%d %d) rotate(%.2f)'/><text x='%d' y='%d' fill='#222' "
                       "stroke='none' text-anchor='middle'>%.2f</text>\n", 18 * sqrt((double)l[1]), 18 * sqrt((double)l[0]), x, y,
                    -57.29578 * atan2((double)Q[3], (double)Q[2]), x, y + 56, (double)(l[0] * l[1]));
        }
        printf("\n");
        fprintf(f, "</g>\n<text x='24' y='%d' fill='#666'>determinant</text>\n", y + 56);
    }
    fprintf(f, "</svg>\n");
    return fclose(f) != 0;
}
