/* SPDX-License-Identifier: MIT */
/* eig_million.c - a million matrices through roln_eig, by family: how many, and the worst residual, orthogonality and eigenvalue
   error in the units of their bounds. Float, or double with -DROLN_DOUBLE. An argument: another number of matrices. Last line:
   N passed, N failed. Progress on stderr. */
#include "eig.h"

#include <stdlib.h>

int main(int argc, char **argv)
{
    const long count = argc > 1 ? atol(argv[1]) : 1000000;
    eig_errors worst[FAMILIES] = {{0, 0, 0}};
    long bad[FAMILIES] = {0}, done, failed = 0, matrices[FAMILIES] = {0};
    uint64_t seed = 20;
    int f;
    for (done = 0; done < count; done++) {
        /* half of them from the families over the whole exponent range; three in four small, the others up to 32 */
        const int any = roln_randint(2, &seed);
        const int n = 1 + roln_randint(roln_randint(4, &seed) ? 8 : 32, &seed);
        eig_errors e = {1e30, 1e30, 1e30};
        f = any ? roln_randint(FAMILIES, &seed) : SPLIT + roln_randint(FAMILIES - SPLIT, &seed);
        family(f, n, &seed);
        if (roln_eig(n, A, l, Q, work) == ROLN_OK) e = eig_check(n);
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
    printf("%ld passed, %ld failed\n", count - failed, failed);
    return failed != 0 || count == 0;
}
