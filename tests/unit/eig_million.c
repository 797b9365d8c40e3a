/* SPDX-License-Identifier: MIT */
/* eig_million.c - a million matrices through roln_eig, by family: how many, and the worst residual, orthogonality and eigenvalue
   error in the units of their bounds; then the most sweeps that they took, by size, beside what a search for the worst matrix
   finds, and the bound. Float, or double with -DROLN_DOUBLE. An argument: another number of matrices. Last line: N passed, N
   failed. Progress on stderr. */
#include "eig.h"

#include <stdlib.h>

enum { SIZES = 33, STARTS = 60, STEPS = 30000, CLIMBED = 8 };

/* Changes the diagonal d and the subdiagonal e of a tridiagonal matrix in one to three places. */
static void change(int n, roln_real *d, roln_real *e, uint64_t *s)
{
    int left = 1 + roln_randint(3, s);
    for (; left > 0; left--) {
        const int i = roln_randint(n, s);
        roln_real *const x = roln_rand(s) >> 63 ? d + i : e + i;
        switch (roln_randint(6, s)) {
        case 0: *x *= 1 + ROLN_C(0.1) * roln_normal(s); break;
        case 1: *x *= (roln_real)powl(10, (ld)roln_normal(s)); break;
        case 2: *x = -*x; break;
        case 3: *x = roln_normal(s); break;
        case 4: *x = d[roln_randint(n, s)]; break;
        default: *x *= 1 + ROLN_C(1e-5) * roln_normal(s);
        }
    }
}

/* The most sweeps that a search finds which changes a matrix at random and keeps what takes no fewer. */
static int climb(int n, uint64_t *s)
{
    int start, k, i, best = 0;
    for (start = 0; start < STARTS; start++) {
        roln_real at[2][CLIMBED], next[2][CLIMBED];
        int most = 0;
        for (i = 0; i < n; i++) {
            at[0][i] = roln_normal(s) * (roln_real)(start % 2 ? 1 : fabsl(any_size(8, s)));
            at[1][i] = roln_normal(s) * (roln_real)fabsl(any_size(start % 4 * 3, s));
        }
        for (k = 0; k < STEPS; k++) {
            memcpy(next, at, sizeof at);
            change(n, next[0], next[1], s);
            memset(A, 0, sizeof *A * (size_t)(n * n));
            for (i = 0; i < n; i++) {
                A[i * n + i] = next[0][i];
                if (i > 0) A[i * n + i - 1] = A[(i - 1) * n + i] = next[1][i];
            }
            eig_cap = ROLN_MAX(1, most - 1);
            if (most > 1 && roln_eig(n, A, l, Q, work) != ROLN_E_NO_CONVERGENCE) continue;
            if (eig_counted(n, &most) != ROLN_OK) return ROLNI_EIG_MOST(n) + 1;
            memcpy(at, next, sizeof at);
        }
        best = ROLN_MAX(best, most);
    }
    eig_cap = 0;
    return best;
}

int main(int argc, char **argv)
{
    const long count = argc > 1 ? atol(argv[1]) : 1000000;
    eig_errors worst[FAMILIES] = {{0, 0, 0}};
    long bad[FAMILIES] = {0}, done, failed = 0, matrices[FAMILIES] = {0};
    uint64_t seed = 20;
    int f, n, found, most[SIZES] = {0};
    for (done = 0; done < count; done++) {
        /* half of them from the families over the whole exponent range; three in four small, the others up to 32 */
        const int any = roln_randint(2, &seed);
        eig_errors e = {1e30, 1e30, 1e30};
        n = 1 + roln_randint(roln_randint(4, &seed) ? 8 : 32, &seed);
        f = any ? roln_randint(FAMILIES, &seed) : SPLIT + roln_randint(FAMILIES - SPLIT, &seed);
        family(f, n, &seed);
        if (eig_counted(n, &most[n]) == ROLN_OK) e = eig_check(n);
        matrices[f]++;
        bad[f] += !(e.residual <= EIG_RESIDUAL && e.orthogonal <= EIG_ORTHOGONAL && e.value <= EIG_VALUE);
        worst[f].residual = fmax(worst[f].residual, e.residual);
        worst[f].orthogonal = fmax(worst[f].orthogonal, e.orthogonal);
        worst[f].value = fmax(worst[f].value, e.value);
        if (done % (count / 100 + 1) == 0) fprintf(stderr, "\r%ld %% of %ld matrices", 100 * done / count, count);
    }
    fprintf(stderr, "\r");
    printf("%-26s %9s %8s %8s %8s %6s   (" TEST_PRECISION "; bounds %d, %d, %d)\n", "family", "matrices",
           "residual", "orthog.", "eigenv.", "failed", EIG_RESIDUAL, EIG_ORTHOGONAL, EIG_VALUE);
    for (f = 0; f < FAMILIES; f++) {
        printf("%-26s %9ld %8.2f %8.2f %8.2f %6ld\n", families[f], matrices[f], worst[f].residual, worst[f].orthogonal,
               worst[f].value, bad[f]);
        failed += bad[f];
    }
    printf("\nsweeps, most; n:   ");
    for (n = 2; n < SIZES; n++) printf(" %3d", n);
    printf("\nof these matrices  ");
    for (n = 2; n < SIZES; n++) printf(" %3d", most[n]);
    printf("\nsearched           ");
    for (n = 2; n < SIZES; n++) {
        found = n <= CLIMBED ? climb(n, &seed) : 0;
        failed += found > ROLNI_EIG_MOST(n);
        printf(n <= CLIMBED ? " %3d" : "   -", found);
        fflush(stdout);
    }
    printf("\nbound              ");
    for (n = 2; n < SIZES; n++) printf(" %3d", n == 2 ? 1 : ROLNI_EIG_MOST(n)); /* of two rows one rotation is the answer */
    printf("\n%ld passed, %ld failed\n", count - failed, failed);
    return failed != 0 || count == 0;
}
