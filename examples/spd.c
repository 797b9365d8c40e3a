/* SPDX-License-Identifier: MIT */
/* spd.c - the SPD maps alone: one header, no model.

   cc -std=c99 -O3 -march=native -fno-math-errno -I. examples/spd.c -o spd -lm */

#include "roln_spd.h"
#include <stdio.h>

enum { n = 3 };

static void print(const char *name, int rows, const roln_real *X)
{
    for (int i = 0; i < rows; i++)
        printf("%-15s %9.5f %9.5f %9.5f\n", i ? "" : name, (double)X[i * n], (double)X[i * n + 1], (double)X[i * n + 2]);
}

int main(void)
{
    const roln_real U[n * n] = {ROLN_C(0.5), ROLN_C(0.2), 0, ROLN_C(0.2), ROLN_C(-0.3), ROLN_C(0.4), 0, ROLN_C(0.4), ROLN_C(0.1)};
    const roln_real P[n * n] = {2, 1, 0, 1, 3, 0, 0, 0, 1}, E[n * n] = {0, 1, 0, 1, 0, 0, 0, 0, 1};
    const roln_real bad[n * n] = {1, 2, 0, 2, 1, 0, 0, 0, 1}, h = ROLN_C(0.01);
    roln_real X[n * n], l[n], Q[n * n], A[n * n], K[n * n], D[n * n], V[n * n], plus[n * n], minus[n * n], d = 0;
    roln_real work[ROLN_SPD_MAP_WORK(n)];

    roln_spd_map(n, ROLN_EXP, 0, NULL, U, X, work); /* X = exp(U) */
    print("exp(U)", n, X);
    roln_eig(n, X, l, Q, work);
    print("its eigenvalues", 1, l);

    roln_chol(n, P, A); /* P = A A^T stands for P^1/2 in exp_P(U) = P^1/2 exp(P^-1/2 U P^-1/2) P^1/2 */
    roln_spd_map(n, ROLN_EXP, 0, A, U, X, work);
    print("exp_P(U)", n, X);
    roln_spd_dist(n, A, X, &d, work);
    printf("%-15s %9.5f\n", "its distance", (double)d);
    roln_spd_map(n, ROLN_LOG, 0, A, X, X, work);
    print("log_P of it", n, X);

    roln_eig(n, U, l, V, work); /* Frechet derivative D exp(U)[E], from the eigenvectors of U */
    roln_exp_dd1(n, l, K);
    roln_spd_map_d(n, K, V, V, E, D, work);
    print("Dexp(U)[E]", n, D);
    for (int i = 0; i < n * n; i++)
        plus[i] = U[i] + h * E[i], minus[i] = U[i] - h * E[i];
    roln_spd_map(n, ROLN_EXP, 0, NULL, plus, plus, work);
    roln_spd_map(n, ROLN_EXP, 0, NULL, minus, minus, work);
    for (int i = 0; i < n * n; i++)
        D[i] = (plus[i] - minus[i]) / (2 * h);
    print("difference", n, D);

    printf("Cholesky of an indefinite matrix: status %d (ROLN_E_NOT_SPD is %d)\n", (int)roln_chol(n, bad, A), ROLN_E_NOT_SPD);
    return 0;
}
