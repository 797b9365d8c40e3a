/* SPDX-License-Identifier: MIT */
/* resample.h - signals at uneven times: one kernel that resamples and filters, its frequency response, a power spectrum with its
   noise floor, a derivative. recording.h uses it. It needs no memory but the caller's.

   The kernel is a local polynomial: at a time `at` the least-squares cubic through the samples of |t - at| < half, with weights
   (1 - ((t - at) / half)^2)^3. Its value there is a weighted sum of samples, the same sum for every signal of a recording, so no
   signal lags behind another one. In the middle of a recording the weights are symmetric: no phase. A cubic passes unchanged.

   Gain of the kernel: 0.71 (-3 dB) at KERNEL_BAND / half, 0.97 at half of that frequency, below 0.03 at twice that frequency. */

#ifndef RESAMPLE_H
#define RESAMPLE_H

#include <math.h>

#define KERNEL_BAND 0.7775
enum { KERNEL_SAMPLES = 6, SPECTRUM = 1024 };

/* Solves A x = (1, 0, ..) of order n <= 4, A symmetric, by Cholesky. Returns 0 if A is singular to 1e-9. */
static int first_column(int n, double A[4][4], double *x)
{
    double L[4][4], y[4];
    int i, j, k;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++) {
            double sum = A[i][j];
            for (k = 0; k < j; k++)
                sum -= L[i][k] * L[j][k];
            if (i == j && !(sum > 1e-9 * A[i][i])) return 0;
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    for (i = 0; i < n; i++) {
        y[i] = i == 0;
        for (k = 0; k < i; k++)
            y[i] -= L[i][k] * y[k];
        y[i] /= L[i][i];
    }
    for (i = n - 1; i >= 0; i--) {
        x[i] = y[i];
        for (k = i + 1; k < n; k++)
            x[i] -= L[k][i] * x[k];
        x[i] /= L[i][i];
    }
    return 1;
}

/* Weights w of the samples from *first on whose sum is the value of the local cubic at time `at`. t [n] grows, or stays. If fewer
   than KERNEL_SAMPLES samples are nearer than `half`, the nearest ones are taken; the degree is lower if they do not determine a
   cubic. Returns the number of weights, at most n; w [n]. */
static int kernel_weights(int n, const double *t, double at, double half, int *first, double *w)
{
    const int least = n < KERNEL_SAMPLES ? n : KERNEL_SAMPLES;
    int a = 0, b = n, order = 4, i, j;
    double c[4] = {0, 0, 0, 0}, S[7] = {0, 0, 0, 0, 0, 0, 0}, reach = half;
    while (a < b) { /* the first sample behind `at` */
        const int mid = a + (b - a) / 2;
        if (t[mid] < at) a = mid + 1;
        else b = mid;
    }
    for (;;) {
        const double before = a > 0 ? at - t[a - 1] : HUGE_VAL, behind = b < n ? t[b] - at : HUGE_VAL;
        const double nearest = before < behind ? before : behind;
        if (nearest >= half && (b - a >= least || nearest >= HUGE_VAL)) break;
        if (nearest >= half) reach = 1.15 * nearest;
        if (before < behind) a--;
        else b++;
    }
    for (i = a; i < b; i++) {
        const double u = (t[i] - at) / reach, v = 1 - u * u;
        double power = v * v * v;
        w[i - a] = power;
        for (j = 0; j < 7; j++, power *= u)
            S[j] += power;
    }
    for (; order > 0; order--) {
        double A[4][4];
        for (i = 0; i < order; i++)
            for (j = 0; j < order; j++)
                A[i][j] = S[i + j];
        if (first_column(order, A, c)) break;
    }
    for (i = a; i < b; i++) {
        const double u = (t[i] - at) / reach;
        double sum = 0;
        for (j = order - 1; j >= 0; j--)
            sum = sum * u + c[j];
        w[i - a] *= sum;
    }
    *first = a;
    return b - a;
}

/* Gain of the kernel at a frequency in Hz, of samples that are dense. */
static double kernel_gain(double hz, double half)
{
    enum { POINTS_OF_KERNEL = 200 };
    double s2 = 0, s4 = 0, one = 0, wave = 0;
    int i;
    for (i = 0; i < POINTS_OF_KERNEL; i++) {
        const double u = (i + 0.5) / POINTS_OF_KERNEL, v = 1 - u * u, w = v * v * v;
        s2 += w * u * u, s4 += w * u * u * u * u;
    }
    for (i = 0; i < POINTS_OF_KERNEL; i++) {
        const double u = (i + 0.5) / POINTS_OF_KERNEL, v = 1 - u * u, l = v * v * v * (s4 - s2 * u * u);
        one += l, wave += l * cos(6.283185307179586 * hz * half * u);
    }
    return wave / one;
}

/* The Fourier transform of x = re + i im, in place; n is a power of 2. */
static void fourier(int n, double *re, double *im)
{
    int i, j = 0, size;
    for (i = 1; i < n; i++) {
        int bit = n >> 1;
        double x;
        for (; j & bit; bit >>= 1)
            j ^= bit;
        j ^= bit;
        if (i < j) x = re[i], re[i] = re[j], re[j] = x, x = im[i], im[i] = im[j], im[j] = x;
    }
    for (size = 2; size <= n; size *= 2) {
        const double turn = -6.283185307179586 / size;
        for (j = 0; j < size / 2; j++) {
            const double c = cos(turn * j), s = sin(turn * j);
            for (i = j; i < n; i += size) {
                const int k = i + size / 2;
                const double x = re[k] * c - im[k] * s, y = re[k] * s + im[k] * c;
                re[k] = re[i] - x, im[k] = im[i] - y;
                re[i] += x, im[i] += y;
            }
        }
    }
}

/* Adds the power of x [n] at n / 2 + 1 frequencies, from 0 on, under a Hann window, without the straight line from end to end;
   its sum over all n frequencies is the mean square. re, im [n] are scratch. n is a power of 2. */
static void add_power(int n, const double *x, double *power, double *re, double *im)
{
    double begin = 0, end = 0;
    int i;
    for (i = 0; i < n / 8; i++)
        begin += x[i] / (n / 8), end += x[n - 1 - i] / (n / 8);
    for (i = 0; i < n; i++) {
        const double line = begin + (end - begin) * (i - n / 16.0) / (n - n / 8.0);
        re[i] = (x[i] - line) * (0.5 - 0.5 * cos(6.283185307179586 * (i + 0.5) / n)), im[i] = 0;
    }
    fourier(n, re, im);
    for (i = 0; i <= n / 2; i++)
        power[i] += (re[i] * re[i] + im[i] * im[i]) / (0.375 * n * (double)n);
}

/* dx = dx/dt at sample i of n, dt apart, by the polynomial through the 7 samples about it, near the ends the first or last 7; of
   fewer samples by the polynomial through all. */
static double derivative(int n, const double *x, int i, double dt)
{
    const int a = n < 7 || i < 3 ? 0 : i > n - 4 ? n - 7 : i - 3, m = n < 7 ? n : 7;
    double sum = 0;
    int j, k, l;
    for (j = 0; j < m; j++) { /* derivative of the Lagrange polynomial of sample a + j, at i - a */
        const double at = i - a;
        double slope = 0;
        for (k = 0; k < m; k++) {
            double product = 1;
            if (k == j) continue;
            for (l = 0; l < m; l++)
                if (l != j && l != k) product *= (at - l) / (j - l);
            slope += product / (j - k);
        }
        sum += slope * x[a + j];
    }
    return sum / dt;
}

#endif
