/* SPDX-License-Identifier: MIT */
/* curves.h - twin of the polynomials that bend a layer, in long double: products of Chebyshev polynomials in the order that
   roln_ae.h states, from the explicit formula of T_k, and the bent layer of the decoder with its derivatives. Include after
   twin.h. */
#ifndef CURVES_H
#define CURVES_H

enum { T_CURVES = 600, T_WIDTH = 16 }; /* most polynomials, most numbers of a vector */

/* How exponents a, b of n variables are ordered: by degree, by the last variable that is there, by its power, by what is left. */
ROLN_FN int t_order(int n, const int *a, const int *b)
{
    int i, last_a = -1, last_b = -1, degree_a = 0, degree_b = 0, rest_a[T_WIDTH], rest_b[T_WIDTH];
    for (i = 0; i < n; i++) {
        rest_a[i] = a[i], rest_b[i] = b[i];
        degree_a += a[i], degree_b += b[i];
        if (a[i]) last_a = i;
        if (b[i]) last_b = i;
    }
    if (degree_a != degree_b) return degree_a - degree_b;
    if (degree_a == 0) return 0;
    if (last_a != last_b) return last_a - last_b;
    if (a[last_a] != b[last_a]) return a[last_a] - b[last_a];
    rest_a[last_a] = rest_b[last_a] = 0;
    return t_order(last_a, rest_a, rest_b);
}

/* All exponents of total degree 2 .. d in that order; returns how many. */
ROLN_FN int t_exponents(int n, int d, int a[][T_WIDTH])
{
    int one[T_WIDTH] = {0}, count = 0, i, sum;
    for (;;) {
        for (i = 0; i < n && one[i] == d; i++) one[i] = 0; /* the next number with n digits 0 .. d */
        if (i == n) return count;
        one[i]++;
        for (sum = 0, i = 0; i < n; i++) sum += one[i];
        if (sum < 2 || sum > d) continue;
        for (i = count++; i > 0 && t_order(n, one, a[i - 1]) < 0; i--) memcpy(a[i], a[i - 1], sizeof *a);
        memcpy(a[i], one, sizeof one);
    }
}

/* x^e, e >= 0, by products: powl would take as long as all else in these tests */
ROLN_FN ld t_power(ld x, int e)
{
    ld y = 1;
    for (; e > 0; e--) y *= x;
    return y;
}

/* t[0..2] = T_k(x), T_k'(x), T_k''(x): k/2 sum_j (-1)^j (k-j-1)! / (j! (k-2j)!) (2x)^(k-2j) */
ROLN_FN void t_chebyshev(int k, ld x, ld t[3])
{
    int j, i;
    t[0] = k == 0, t[1] = t[2] = 0;
    for (j = 0; k > 0 && 2 * j <= k; j++) {
        const int e = k - 2 * j;
        ld c = (ld)k / 2 * (j % 2 ? -1 : 1);
        for (i = 1; i <= k - j - 1; i++) c *= (ld)i;
        for (i = 1; i <= j; i++) c /= (ld)i;
        for (i = 1; i <= e; i++) c /= (ld)i;
        t[0] += c * t_power(2 * x, e);
        if (e > 0) t[1] += c * 2 * (ld)e * t_power(2 * x, e - 1);
        if (e > 1) t[2] += c * 4 * (ld)(e * (e - 1)) * t_power(2 * x, e - 2);
    }
}

/* p of m exponents, P = dp/dz [m][n], Pd its rate along v [m][n]. */
ROLN_FN void t_curves(int n, int m, int a[][T_WIDTH], const ld *z, const ld *v, ld *p, ld *P, ld *Pd)
{
    ld t[T_WIDTH][3];
    int k, i, j, l;
    for (k = 0; k < m; k++) {
        for (p[k] = 1, i = 0; i < n; i++) t_chebyshev(a[k][i], z[i], t[i]), p[k] *= t[i][0];
        for (i = 0; i < n; i++) {
            P[k * n + i] = t[i][1], Pd[k * n + i] = t[i][2] * v[i];
            for (j = 0; j < n; j++)
                if (j != i) P[k * n + i] *= t[j][0], Pd[k * n + i] *= t[j][0];
            for (j = 0; j < n; j++) {
                ld term = t[i][1] * t[j][1] * v[j];
                for (l = 0; l < n; l++)
                    if (l != i && l != j) term *= t[l][0];
                if (j != i) Pd[k * n + i] += term;
            }
        }
    }
}

/* x = b + Phi z + (I - Phi Psi^T) W^T p(z) [N], G = dx/dz [N][n] and its rate Gd along v. layer: Phi^T, Psi^T, b, W. */
ROLN_FN void t_bend(int N, int n, int d, const ld *layer, const ld *z, const ld *v, ld *x, ld *G, ld *Gd)
{
    static int a[T_CURVES][T_WIDTH];
    static ld p[T_CURVES], P[T_CURVES * T_WIDTH], Pd[T_CURVES * T_WIDTH];
    const int m = t_exponents(n, d, a);
    const ld *phi = layer, *psi = phi + n * N, *b = psi + n * N, *W = b + N;
    int i, j, k, col;
    t_curves(n, m, a, z, v, p, P, Pd);
    for (col = 0; col <= 2 * n; col++) { /* x, then the columns of G and Gd */
        ld y[T_WIDTH], s[T_WIDTH];
        for (i = 0; i < N; i++)
            for (y[i] = 0, k = 0; k < m; k++)
                y[i] += W[k * N + i] * (col == 0 ? p[k] : col <= n ? P[k * n + col - 1] : Pd[k * n + col - 1 - n]);
        for (j = 0; j < n; j++) {
            s[j] = col == 0 ? z[j] : j == col - 1;
            for (i = 0; i < N; i++) s[j] -= psi[j * N + i] * y[i];
        }
        for (i = 0; i < N; i++) {
            ld sum = y[i] + (col == 0 ? b[i] : 0);
            for (j = 0; j < n; j++) sum += phi[j * N + i] * s[j];
            if (col == 0) x[i] = sum;
            else if (col <= n) G[i * n + col - 1] = sum;
            else Gd[i * n + col - 1 - n] = sum;
        }
    }
}

#endif
