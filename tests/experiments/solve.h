/* SPDX-License-Identifier: MIT */
/* solve.h - what is done in double: roln's own kernels compiled with ROLN_DOUBLE, in a translation unit apart. */
#ifndef SOLVE_H
#define SOLVE_H

#include <stddef.h>

/* POD of q - mean (mean NULL: of q), q [rows][N]: W [N][n], the leading directions, the strongest first. 0, or -1 with the reason
   on stderr. */
int pod_solve(int N, size_t rows, const float *q, const float *mean, int n, double *W);

struct opinf_data {
    int N;
    size_t rows;
    const float *q, *qd, *qdd, *tau;    /* [rows][N]; tau at the sample, NULL: none */
    const float *mean;                  /* [N], subtracted from q; NULL: none       */
};

struct opinf_operators {                /* zdd + C zd + K z - f = W^T tau, z = W^T (q - mean) */
    double *W, *K, *C, *f;              /* [N][n], [n][n], [n][n], [n] */
};

/* Fit; affine 0: C = 0, f = 0. 0, or -1 with the reason on stderr. */
int opinf_solve(int affine, int n, const struct opinf_data *d, struct opinf_operators *o);

/* P = (I + h/2 C + h^2/4 K)^-1, [n][n]. 0, or -1. */
int opinf_midpoint(int n, double h, const double *K, const double *C, double *P);

#endif
