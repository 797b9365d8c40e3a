/* SPDX-License-Identifier: MIT */
/* roln_riem.h - manifolds of parameters, and optimisers that stay on them.

   1 blocks            a manifold is a table of verbs, a product manifold a table of blocks
   2 biorthogonal      pairs (Phi, Psi) with Psi^T Phi = I
   3 SPD               symmetric positive-definite matrices, affine-invariant metric
   4 Stiefel           matrices with orthonormal rows
   5 optimisers        settings, schedule, update of a product of blocks: Riemannian Adam (AMSGrad)
   6 large systems     symmetric, hundreds to thousands of unknowns: products, Cholesky, solve
   7 Gauss-Newton      rows of a Jacobian, damped least squares, acceptance of a step
   8 limited memory    Riemannian BFGS of a few pairs of vectors, for a loss over fixed data

   To add a manifold: write its verbs in a file of your own, name them in a const roln_manifold, point blocks at it (two
   examples in tests/unit/manifolds.h). Nothing here changes. Each manifold says how it carries a tangent to another point.
   roln.h trains Euclidean, biorthogonal and SPD blocks with roln_adam_update or roln_newton_step, and finds encoders on Stiefel
   ones with roln_lbfgs_step; the manifolds by themselves serve programs without it. */

#ifndef ROLN_RIEM_H
#define ROLN_RIEM_H

#include "roln_spd.h"

/* ---- 1 blocks --------------------------------------------------------------------------------- */

/* The verbs of a manifold; rows, cols are the sizes of a block. A tangent has as many numbers as a point, in coordinates
   that the manifold chooses. Verbs are given copies: one that fails may leave them in any state, and its status is that of
   the update. */
typedef struct {
    int (*size)(int rows, int cols); /* numbers of a point */
    int (*work)(int rows, int cols); /* work of tangent and of retract, whichever needs more */
    /* gm, count + 1 rows that begin stride numbers apart, in: Euclidean gradients at x and, last, the momentum at the previous
       point; out: Riemannian gradients, momentum at x */
    roln_status (*tangent)(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm, roln_real *work);
    /* <u, v> at x; NULL: the dot product of the coordinates */
    roln_real (*inner)(int rows, int cols, const roln_real *x, const roln_real *u, const roln_real *v);
    /* xn = R_x(u), at least of first order; xn may be u. ROLN_E_RANGE: no update could go on from the end of the step. Any other
       failure: the step is too long. */
    roln_status (*retract)(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work);
} roln_manifold;

#define ROLN_EUCLIDEAN NULL /* the manifold of rows x cols free numbers, each with moments of its own */
#define ROLN_GROUPS 3       /* learning-rate groups */

/* One factor of a product manifold; the blocks of a table follow each other in the parameter array without gaps. */
typedef struct {
    const roln_manifold *manifold; /* ROLN_EUCLIDEAN, &roln_biorthogonal, &roln_spd, &roln_stiefel, or your own */
    int rows, cols;                /* as the manifold reads them: of a biorthogonal pair n, N, of Stiefel k, m */
    int group;                     /* learning-rate group */
} roln_block;

/* Numbers in a block. */
ROLN_FN int roln_block_size(const roln_block *b)
{
    return b->manifold == ROLN_EUCLIDEAN ? b->rows * b->cols : b->manifold->size(b->rows, b->cols);
}

/* Second moments of a block: one per number where Euclidean, one for the whole of a manifold block. */
ROLN_FN int roln_block_moments(const roln_block *b)
{
    const int size = roln_block_size(b);
    return b->manifold == ROLN_EUCLIDEAN ? size : size > 0;
}

/* xn = R_x(f u) if the verb takes that step. If not, 7 shorter ones are tried, the first a 16th as long and no coordinate above 1,
   each of the others a 16th of the one before. If none is taken, the point waits: xn = x, with ROLN_OK, so that the moments of an
   optimiser go on. A refused update would keep the momentum that led there, and so refuse the next ones for ever. u may not be xn.
   Status of the verb if u is not finite (test_riem.c: test_back). */
ROLN_FN roln_status rolni_reach(const roln_block *b, roln_real f, const roln_real *x, const roln_real *u, roln_real *xn,
                                roln_real *work)
{
    enum { ROLNI_REACHES = 8 };
    const int size = roln_block_size(b);
    roln_status st = ROLN_OK;
    roln_real top = 0;
    int tries, i;
    for (i = 0; i < size; i++)
        top = ROLN_MAX(top, ROLN_ABS(u[i]));
    for (tries = 0; tries < ROLNI_REACHES; tries++) {
        for (i = 0; i < size; i++)
            xn[i] = f * u[i];
        if ((st = b->manifold->retract(b->rows, b->cols, x, xn, xn, work)) == ROLN_OK) return ROLN_OK;
        f /= 16;
        if (ROLN_ABS(f) * top > 1) f = (f < 0 ? -1 : 1) / top;
    }
    rolni_copy(size, x, xn);
    return roln_all_finite(size, u) ? ROLN_OK : st;
}

/* ---- 2 biorthogonal --------------------------------------------------------------------------- */

/* A point is x = (Phi^T, Psi^T), [2][n][N], with Psi^T Phi = I; a tangent (X, Y) satisfies Y^T Phi + Psi^T X = 0.
   Frobenius metric. To carry a tangent to another point is to project it there. Otto, Macchio, Rowley 2023. */

/* Project count ambient pairs u (in and out), [2][n][N] each, which begin stride numbers apart, onto the tangent space at x
   [2][n][N]:
   (X - Psi A, Y - Phi A^T) with (Psi^T Psi) A + A (Phi^T Phi) = Y^T Phi + Psi^T X, solved in the eigenbases of the two
   Gram matrices; all denominators are positive. They are shared by the count pairs. u is untouched unless ROLN_OK; NaN
   in u passes through.
   work [ROLN_BIORTH_PROJECT_WORK(n)]. Status of roln_eig; ROLN_E_ILL_CONDITIONED if Phi or Psi has lost rank.
   Cost: (2 + 4 count) n^2 N + (18 + 4 count) n^3 multiply-adds. */
#define ROLN_BIORTH_PROJECT_MEM(X, n) X(Ua, (n) * (n)) X(Ub, (n) * (n)) X(C, (n) * (n)) X(ra, n) X(rb, n)
#define ROLNI_PROJECT_MEM(X, n) X(D, (n) * (n)) /* in the room of roln_eig */
#define ROLN_BIORTH_PROJECT_WORK(n) \
    (0 ROLN_BIORTH_PROJECT_MEM(ROLNI_SIZE, n) + ROLN_MAX(0 ROLNI_PROJECT_MEM(ROLNI_SIZE, n), ROLN_EIG_WORK(n)))
ROLN_FN roln_status roln_biorth_project(int n, int N, int count, int stride, const roln_real *x, roln_real *u, roln_real *work)
{
    const roln_real *phi = x, *psi = x + n * N;
    roln_status st;
    int c, i, j;
    ROLN_BIORTH_PROJECT_MEM(ROLNI_CARVE, n)
    roln_mm_bt(n, N, n, psi, psi, C);
    if ((st = roln_eig(n, C, ra, Ua, work)) != ROLN_OK) return st;
    roln_mm_bt(n, N, n, phi, phi, C);
    if ((st = roln_eig(n, C, rb, Ub, work)) != ROLN_OK) return st;
    if (!(ra[0] + rb[0] > (ra[n - 1] + rb[n - 1]) * ROLN_EPS)) return ROLN_E_ILL_CONDITIONED;
    ROLNI_PROJECT_MEM(ROLNI_CARVE, n)
    for (c = 0; c < count; c++, u += stride) {
        roln_real *X = u, *Y = u + n * N;
        roln_mm_bt(n, N, n, Y, phi, C); /* C = Y^T Phi + Psi^T X */
        roln_mm_bt(n, N, n, psi, X, D);
        for (i = 0; i < n * n; i++)
            C[i] += D[i];
        roln_mm(n, n, n, Ua, C, D); /* -A in the eigenbases */
        roln_mm_bt(n, n, n, D, Ub, C);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                C[i * n + j] /= -(ra[i] + rb[j]);
        roln_mm(n, n, n, C, Ub, D); /* and back: C = -A, D = -A^T */
        rolni_zero(n * n, C);
        roln_mm_at(n, n, n, Ua, D, C);
        for (i = 0; i < n; i++)
            for (j = 0; j < n; j++)
                D[j * n + i] = C[i * n + j];
        roln_mm_at(n, n, N, C, psi, X); /* X^T -= A^T Psi^T */
        roln_mm_at(n, n, N, D, phi, Y); /* Y^T -= A Phi^T */
    }
    return ROLN_OK;
}

/* Retraction: Psi+ = Psi + Y, Phi+ = (Phi + X) [(Psi + Y)^T (Phi + X)]^-1, which restores Psi^T Phi = I at every step.
   x, u [2][n][N] in; xn [2][n][N] out (xn may be u, not x). work [ROLN_BIORTH_RETRACT_WORK(n, N)].
   ROLN_E_ILL_CONDITIONED if the inverse is: the step is too long; xn is then scratch. */
#define ROLN_BIORTH_RETRACT_MEM(X, n, N) X(W, (n) * (n)) X(inv, (n) * (n)) X(phi, (n) * (N))
#define ROLN_BIORTH_RETRACT_WORK(n, N) (0 ROLN_BIORTH_RETRACT_MEM(ROLNI_SIZE, n, N) + ROLN_INV_WORK(n))
ROLN_FN roln_status roln_biorth_retract(int n, int N, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    roln_real *psi = xn + n * N;
    roln_status st;
    int i;
    ROLN_BIORTH_RETRACT_MEM(ROLNI_CARVE, n, N)
    for (i = 0; i < n * N; i++) {
        phi[i] = x[i] + u[i];
        psi[i] = x[n * N + i] + u[n * N + i];
    }
    roln_mm_bt(n, N, n, psi, phi, W);
    if ((st = roln_inv(n, W, inv, work)) != ROLN_OK) return st;
    rolni_zero(n * N, xn);
    roln_mm_at(n, n, N, inv, phi, xn);
    return ROLN_OK;
}

/* As a block: rows = n, cols = N.
   |Psi^T Phi - I| is a part of eps |Phi| |Psi|, and so is what rounding does to a tangent. A block keeps its point where
   |Phi| |Psi| <= 36 + 2 n and neither norm is above 16 (36 + 2 n): ROLN_E_RANGE for a step that would end outside, or, from
   outside, further outside than it began. Then |Psi^T Phi - I| <= 84 eps up to n = 16, 1e-5 in float (test_riem.c: test_back). */
#define ROLN_BIORTH_BLOCK_WORK(n, N) ROLN_MAX(ROLN_BIORTH_PROJECT_WORK(n), ROLN_BIORTH_RETRACT_WORK(n, N))
ROLN_FN int rolni_biorth_size(int rows, int cols)
{
    return 2 * rows * cols;
}

ROLN_FN int rolni_biorth_work(int rows, int cols)
{
    return ROLN_BIORTH_BLOCK_WORK(rows, cols);
}

ROLN_FN roln_status rolni_biorth_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm,
                                         roln_real *work)
{
    return roln_biorth_project(rows, cols, count + 1, stride, x, gm, work);
}

/* How far a point [2][n][N] is outside, |Phi| at least phi: 1 on the edge, less inside. */
ROLN_FN roln_real rolni_biorth_outside(int n, int N, const roln_real *x, roln_real phi)
{
    const roln_real *psi = x + n * N;
    const roln_real a = ROLN_MAX(phi, ROLN_SQRT(roln_dot(n * N, x, x))), b = ROLN_SQRT(roln_dot(n * N, psi, psi));
    return ROLN_MAX(a * b, ROLN_MAX(a, b) / 16) / ROLNI_AS(roln_real, 36 + 2 * n);
}

/* The rounding of Phi+ = (Phi + X) W^-1 is a part of eps |Phi + X| |W^-1| / sqrt(n), |Phi+| or more. */
ROLN_FN roln_status rolni_biorth_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    const int n = rows, N = cols;
    const roln_status st = roln_biorth_retract(n, N, x, u, xn, work);
    roln_real end;
    ROLN_BIORTH_RETRACT_MEM(ROLNI_CARVE, n, N)
    (void)W;
    if (st != ROLN_OK) return st;
    end = ROLN_SQRT(roln_dot(n * N, phi, phi) * (roln_dot(n * n, inv, inv) / ROLNI_AS(roln_real, n)));
    end = rolni_biorth_outside(n, N, xn, end);
    return end <= 1 || end < rolni_biorth_outside(n, N, x, 0) ? ROLN_OK : ROLN_E_RANGE;
}

ROLNI_TABLE roln_manifold roln_biorthogonal = {rolni_biorth_size, rolni_biorth_work, rolni_biorth_tangent, NULL,
                                               rolni_biorth_retract};

/* ---- 3 SPD ------------------------------------------------------------------------------------ */

/* Tangents at X = A A^T (Cholesky) are kept in the frame of A: U = A u A^T is stored as the symmetric u. The affine-
   invariant metric <U,U>_X = tr(X^-1 U X^-1 U) then is |u|_F^2, and to carry a tangent to another point is to keep u,
   an isometry. */

/* Riemannian gradient X sym(G) X of the Euclidean one G, in the frame: u = A^T sym(G) A. X, G [n][n] in, u [n][n] out
   (may be G). work [ROLN_SPD_RGRAD_WORK(n)]. ROLN_E_NOT_SPD leaves u untouched. */
#define ROLN_SPD_RGRAD_MEM(X, n) X(A, (n) * (n)) X(t, (n) * (n))
#define ROLN_SPD_RGRAD_WORK(n) (0 ROLN_SPD_RGRAD_MEM(ROLNI_SIZE, n))
ROLN_FN roln_status roln_spd_rgrad(int n, const roln_real *X, const roln_real *G, roln_real *u, roln_real *work)
{
    int i, j;
    ROLN_SPD_RGRAD_MEM(ROLNI_CARVE, n)
    if (roln_chol(n, X, A) != ROLN_OK) return ROLN_E_NOT_SPD;
    for (i = 0; i < n; i++)
        for (j = 0; j <= i; j++)
            u[i * n + j] = u[j * n + i] = (G[i * n + j] + G[j * n + i]) / 2;
    roln_mm(n, n, n, u, A, t);
    rolni_zero(n * n, u);
    roln_mm_at(n, n, n, A, t, u);
    return ROLN_OK;
}

/* S = A (I + u + u^2/2) A^T, exactly symmetric, and its Cholesky factor L. */
ROLN_FN roln_status rolni_spd_step(int n, const roln_real *A, const roln_real *u, roln_real *S, roln_real *L)
{
    int i, j;
    roln_mm(n, n, n, u, u, S);
    for (i = 0; i < n * n; i++)
        S[i] = (i % (n + 1) == 0) + u[i] + S[i] / 2;
    roln_mm(n, n, n, A, S, L);
    roln_mm_bt(n, n, n, L, A, S);
    for (i = 0; i < n; i++)
        for (j = 0; j < i; j++)
            S[j * n + i] = S[i * n + j];
    return roln_chol(n, S, L);
}

/* Retraction X+ = X + U + 1/2 U X^-1 U = A (I + u + u^2/2) A^T, positive definite for every u. X, u [n][n] in, Xn [n][n]
   out (may be X or u), made exactly symmetric. work [ROLN_SPD_RETRACT_WORK(n)]. ROLN_E_NOT_SPD: X was not, or the step
   is so long that the result is not to working precision; Xn is then untouched. */
#define ROLN_SPD_RETRACT_MEM(X, n) X(A, (n) * (n)) X(S, (n) * (n)) X(L, (n) * (n))
#define ROLN_SPD_RETRACT_WORK(n) (0 ROLN_SPD_RETRACT_MEM(ROLNI_SIZE, n))
ROLN_FN roln_status roln_spd_retract(int n, const roln_real *X, const roln_real *u, roln_real *Xn, roln_real *work)
{
    ROLN_SPD_RETRACT_MEM(ROLNI_CARVE, n)
    if (roln_chol(n, X, A) != ROLN_OK || rolni_spd_step(n, A, u, S, L) != ROLN_OK) return ROLN_E_NOT_SPD;
    rolni_copy(n * n, S, Xn);
    return ROLN_OK;
}

/* As a block: rows = cols = n. The momentum stays as it is.
   A block keeps its point where the next update can still factor it: tr(X) tr(X^-1), which bounds the condition from above, below
   1 / (64 eps) (131,000 in float), and both traces below ROLN_SPD_TRACE: ROLN_E_RANGE for a step that would end outside, or, from
   outside, further outside than it began (test_riem.c: test_edge). */
#ifdef ROLN_DOUBLE
#define ROLN_SPD_TRACE 2.5822498780869086e120 /* 2^400 */
#else
#define ROLN_SPD_TRACE 1.12589991e15f /* 2^50 */
#endif
#define ROLN_SPD_BLOCK_WORK(n) ROLN_MAX(ROLN_SPD_RGRAD_WORK(n), ROLN_SPD_RETRACT_WORK(n))

/* How far X = L L^T is outside: 1 on the edge, less inside. R [n][n]: scratch. */
ROLN_FN roln_real rolni_spd_outside(int n, const roln_real *X, const roln_real *L, roln_real *R)
{
    roln_real trace = 0, inverse;
    int i;
    for (i = 0; i < n; i++)
        trace += X[i * (n + 1)];
    rolni_lower_inv(n, L, R);
    inverse = roln_dot(n * n, R, R);
    return ROLN_MAX(64 * ROLN_EPS * trace * inverse, ROLN_MAX(trace, inverse) / ROLN_SPD_TRACE);
}

ROLN_FN int rolni_spd_size(int rows, int cols)
{
    (void)cols;
    return rows * rows;
}

ROLN_FN int rolni_spd_work(int rows, int cols)
{
    (void)cols;
    return ROLN_SPD_BLOCK_WORK(rows);
}

ROLN_FN roln_status rolni_spd_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm,
                                      roln_real *work)
{
    roln_status st = ROLN_OK;
    (void)cols;
    for (; count > 0 && st == ROLN_OK; count--, gm += stride)
        st = roln_spd_rgrad(rows, x, gm, gm, work);
    return st;
}

/* ROLN_E_NOT_SPD: x is not. ROLN_E_NOT_FINITE: the end of the step is not. xn is written only on ROLN_OK and, as scratch, on
   ROLN_E_RANGE. */
ROLN_FN roln_status rolni_spd_retract(int rows, int cols, const roln_real *x, const roln_real *u, roln_real *xn, roln_real *work)
{
    const int n = rows;
    roln_status st;
    roln_real end;
    (void)cols;
    ROLN_SPD_RETRACT_MEM(ROLNI_CARVE, n)
    if (roln_chol(n, x, A) != ROLN_OK) return ROLN_E_NOT_SPD;
    st = rolni_spd_step(n, A, u, S, L);
    if (!roln_all_finite(n * n, S)) return ROLN_E_NOT_FINITE;
    if (st != ROLN_OK) return ROLN_E_RANGE;
    end = rolni_spd_outside(n, S, L, xn); /* u is not needed any more: xn serves as scratch */
    if (!(end <= 1) && !(end < rolni_spd_outside(n, x, A, xn))) return ROLN_E_RANGE;
    rolni_copy(n * n, S, xn);
    return ROLN_OK;
}

ROLNI_TABLE roln_manifold roln_spd = {rolni_spd_size, rolni_spd_work, rolni_spd_tangent, NULL, rolni_spd_retract};

/* ---- 4 Stiefel -------------------------------------------------------------------------------- */

/* A point X [k][m], k <= m, has orthonormal rows, X X^T = I; k = 1: the sphere, k = m: the
   orthogonal group. A tangent U satisfies U X^T + X U^T = 0. Frobenius metric. To carry a tangent to another point is to
   project it there. Edelman, Arias, Smith 1998; Absil, Mahony, Sepulchre 2008. */

/* Project count ambient matrices Z [k][m] (in and out), which begin stride numbers apart, onto the tangent space at X [k][m]:
   Z - sym(Z X^T) X.
   NaN passes through. work [ROLN_STIEFEL_PROJECT_WORK(k)]. Cost 2 count k^2 m. */
#define ROLN_STIEFEL_PROJECT_WORK(k) ((k) * (k))
ROLN_FN void roln_stiefel_project(int k, int m, int count, int stride, const roln_real *X, roln_real *Z, roln_real *work)
{
    roln_real *S = work;
    int c, i, j;
    for (c = 0; c < count; c++, Z += stride) {
        roln_mm_bt(k, m, k, Z, X, S);
        for (i = 0; i < k; i++)
            for (j = 0; j <= i; j++)
                S[i * k + j] = S[j * k + i] = -(S[i * k + j] + S[j * k + i]) / 2;
        roln_mm_at(k, k, m, S, X, Z);
    }
}

/* X = L^-1 X with L L^T = X X^T (Cholesky-QR), and once more if that lost digits: the rows of X [k][m], in and out, become
   orthonormal to rounding (test_riem.c: test_stiefel). L [k][k]: work. ROLN_E_ILL_CONDITIONED as in roln_stiefel_retract; X is then
   scratch. */
ROLN_FN roln_status rolni_orthonormal(int k, int m, roln_real *X, roln_real *L)
{
    int pass, i, j;
    for (pass = 0; pass < 2; pass++) {
        roln_real top = 0, low;
        roln_mm_bt(k, m, k, X, X, L);
        for (i = 0; i < k; i++)
            top = L[i * k + i] > top ? L[i * k + i] : top;
        if (roln_chol(k, L, L) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
        for (low = top, i = 0; i < k; i++) /* top / low: about the condition of X X^T */
            low = L[i * k + i] * L[i * k + i] < low ? L[i * k + i] * L[i * k + i] : low;
        if (!(low > 64 * ROLN_EPS * top)) return ROLN_E_ILL_CONDITIONED;
        for (i = 0; i < k; i++) { /* L x = X by rows */
            for (j = 0; j < i; j++)
                L[i * k + j] = -L[i * k + j];
            roln_mm_at(1, i, m, L + i * k, X, X + i * m);
            for (j = 0; j < m; j++)
                X[i * m + j] /= L[i * k + i];
        }
        if (top <= 2 * low) break;
    }
    return ROLN_OK;
}

/* QR retraction X+ = L^-1 (X + U), L L^T = (X + U)(X + U)^T = I + U U^T: restores X X^T = I at every step.
   X, U [k][m] in; Xn [k][m] out (may be X or U). work [ROLN_STIEFEL_RETRACT_WORK(k, m)]. ROLN_E_ILL_CONDITIONED if X + U
   has lost rank to working precision, or is not finite: the step is too long; Xn is then untouched.
   Cost 3/2 k^2 m + k^3/6, twice that where |U| is above 1. */
#define ROLN_STIEFEL_RETRACT_MEM(X, k, m) X(Y, (k) * (m)) X(L, (k) * (k))
#define ROLN_STIEFEL_RETRACT_WORK(k, m) (0 ROLN_STIEFEL_RETRACT_MEM(ROLNI_SIZE, k, m))
ROLN_FN roln_status roln_stiefel_retract(int k, int m, const roln_real *X, const roln_real *U, roln_real *Xn, roln_real *work)
{
    int i;
    ROLN_STIEFEL_RETRACT_MEM(ROLNI_CARVE, k, m)
    for (i = 0; i < k * m; i++)
        Y[i] = X[i] + U[i];
    if (rolni_orthonormal(k, m, Y, L) != ROLN_OK) return ROLN_E_ILL_CONDITIONED;
    rolni_copy(k * m, Y, Xn);
    return ROLN_OK;
}

/* A random point X [k][m], uniform on the manifold as far as roln_normal is normal: Q of normal deviates, which are drawn
   again (it does not bias Q) where ill-conditioned. work [ROLN_STIEFEL_INIT_WORK(k)]. ROLN_E_ILL_CONDITIONED if eight
   draws in a row are, which is not to be expected; X is then scratch. */
#define ROLN_STIEFEL_INIT_WORK(k) ((k) * (k))
ROLN_FN roln_status roln_stiefel_init(int k, int m, roln_real *X, uint64_t *seed, roln_real *work)
{
    roln_status st = ROLN_E_ILL_CONDITIONED;
    int draw, i;
    for (draw = 0; draw < 8 && st != ROLN_OK; draw++) {
        for (i = 0; i < k * m; i++)
            X[i] = roln_normal(seed);
        st = rolni_orthonormal(k, m, X, work);
    }
    return st;
}

/* As a block: rows = k, cols = m. */
#define ROLN_STIEFEL_BLOCK_WORK(k, m) ROLN_MAX(ROLN_STIEFEL_PROJECT_WORK(k), ROLN_STIEFEL_RETRACT_WORK(k, m))
ROLN_FN int rolni_stiefel_size(int rows, int cols)
{
    return rows * cols;
}

ROLN_FN int rolni_stiefel_work(int rows, int cols)
{
    return ROLN_STIEFEL_BLOCK_WORK(rows, cols);
}

ROLN_FN roln_status rolni_stiefel_tangent(int rows, int cols, const roln_real *x, int count, int stride, roln_real *gm,
                                          roln_real *work)
{
    roln_stiefel_project(rows, cols, count + 1, stride, x, gm, work);
    return ROLN_OK;
}

ROLNI_TABLE roln_manifold roln_stiefel = {rolni_stiefel_size, rolni_stiefel_work, rolni_stiefel_tangent, NULL,
                                          roln_stiefel_retract};

/* ---- 5 optimisers ----------------------------------------------------------------------------- */

/* Settings. A group with learning rate 0 is frozen: its parameters and moments stay as they are. */
typedef struct {
    roln_real lr[ROLN_GROUPS]; /* learning rates; on a manifold block the length of a step */
    roln_real beta1, beta2;    /* Adam: 0.9, 0.999 */
    roln_real eps;             /* Adam: 1e-8 */
    roln_real decay;           /* weight decay, added to the Euclidean gradient; 0: none */
    roln_real clip;            /* bound of the norm of the whole gradient; 0: none */
} roln_opt;

/* The usual settings: learning rates of groups 0 (pairs of the autoencoder), 1 (networks) and 2 (biases of the autoencoder; like
   the pairs, but where their steps are the noisier, as in wide layers, a hundredth of it is better). */
#define ROLN_OPT(lr_ae, lr_net) {{lr_ae, lr_net, lr_ae}, ROLN_C(0.9), ROLN_C(0.999), ROLN_C(1e-8), 0, 10}

/* Adam's moments: m in the layout of the parameters; v and the largest v so far, roln_block_moments numbers for each block. */
typedef struct {
    roln_real *m, *v, *v_max;
} roln_moments;

/* What Adam carries beside them. Zero-initialised: a fresh start. Copy it with the moments to resume, bit for bit. */
typedef struct {
    uint32_t t;       /* updates done */
    roln_real unbias1, unbias2; /* 1 - beta1^t, 1 - beta2^t */
} roln_adam;

/* Learning-rate factor at step t of total: rises linearly over warmup steps, then falls smoothly (cubic) from 1 to last. */
ROLN_FN roln_real roln_schedule(uint32_t t, uint32_t warmup, uint32_t total, roln_real last)
{
    roln_real x;
    if (t < warmup) return ROLNI_AS(roln_real, t + 1) / ROLNI_AS(roln_real, warmup);
    if (t >= total) return last;
    x = ROLNI_AS(roln_real, t - warmup) / ROLNI_AS(roln_real, total - warmup);
    return last + (1 - last) * (1 - x * x * (3 - 2 * x));
}

/* Norm of grad over the groups that are not frozen, times scale. */
ROLN_FN roln_real rolni_grad_norm(int blocks, const roln_block *table, const roln_opt *opt, roln_real scale, const roln_real *grad)
{
    roln_real sum = 0;
    int b;
    for (b = 0; b < blocks; b++) {
        const int size = roln_block_size(table + b);
        if (opt->lr[table[b].group] > 0) sum += roln_dot(size, grad, grad);
        grad += size;
    }
    return scale * ROLN_SQRT(sum);
}

/* Numbers that an update keeps of a block until all blocks have succeeded: of a manifold block the new point, momentum
   and moments. */
ROLN_FN int rolni_keep(const roln_block *b)
{
    const int size = roln_block_size(b);
    return b->manifold == ROLN_EUCLIDEAN || size == 0 ? 0 : 2 * size + 2;
}

ROLN_FN int rolni_keep_all(int blocks, const roln_block *table)
{
    int b, sum = 0;
    for (b = 0; b < blocks; b++)
        sum += rolni_keep(table + b);
    return sum;
}

/* Work of an update: what it keeps, and behind that the largest work of a verb. */
ROLN_FN int roln_update_work(int blocks, const roln_block *table)
{
    int b, verb = 0;
    for (b = 0; b < blocks; b++) {
        const int need = rolni_keep(table + b) > 0 ? table[b].manifold->work(table[b].rows, table[b].cols) : 0;
        verb = ROLN_MAX(verb, need);
    }
    return rolni_keep_all(blocks, table) + verb;
}

/* A block as an update of the product meets it. keep: where a manifold block leaves [x+][m+][v+][v_max+] until all blocks have
   succeeded. */
typedef struct {
    const roln_block *block;
    int size;
    roln_real lr;
    const roln_real *grad;
    roln_real *x, *keep;
    roln_moments mom; /* of this block */
} rolni_factor;

/* Settings of an update, common to all blocks. */
typedef struct {
    const roln_opt *opt;
    roln_adam adam;
    roln_real scale;
} rolni_rule;

ROLN_FN void rolni_write_kept(const rolni_factor *p)
{
    rolni_copy(p->size, p->keep, p->x);
    rolni_copy(p->size, p->keep + p->size, p->mom.m);
    *p->mom.v = p->keep[2 * p->size];
    *p->mom.v_max = p->keep[2 * p->size + 1];
}

/* Adam on free numbers: checks that the new ones are finite, or writes them. */
ROLN_FN roln_status rolni_adam_flat(const rolni_rule *r, const rolni_factor *p, int write)
{
    const roln_opt *const o = r->opt;
    int i;
    for (i = 0; i < p->size; i++) {
        const roln_real g = r->scale * p->grad[i] + o->decay * p->x[i];
        const roln_real m = o->beta1 * p->mom.m[i] + (1 - o->beta1) * g, v = o->beta2 * p->mom.v[i] + (1 - o->beta2) * (g * g);
        const roln_real v_max = v > p->mom.v_max[i] ? v : p->mom.v_max[i];
        const roln_real x = p->x[i] - p->lr * (m / r->adam.unbias1) / (ROLN_SQRT(v_max / r->adam.unbias2) + o->eps);
        if (write) p->x[i] = x, p->mom.m[i] = m, p->mom.v[i] = v, p->mom.v_max[i] = v_max;
        else if (!roln_finite(x) || !roln_finite(v_max)) return ROLN_E_NOT_FINITE;
    }
    return ROLN_OK;
}

/* Adam on a manifold block, into keep: one second moment, of the length of the gradient. */
ROLN_FN roln_status rolni_adam_curved(const rolni_rule *r, const rolni_factor *p, roln_real *work)
{
    const roln_opt *const o = r->opt;
    const roln_manifold *const M = p->block->manifold;
    const int size = p->size, rows = p->block->rows, cols = p->block->cols;
    roln_real *const keep = p->keep, *const g = keep, *const m = keep + size;
    roln_real v, v_max, top = 0;
    roln_status st;
    int i;
    for (i = 0; i < size; i++)
        g[i] = r->scale * p->grad[i] + o->decay * p->x[i];
    if (!roln_finite(roln_dot(size, g, g))) return ROLN_E_NOT_FINITE;
    rolni_copy(size, p->mom.m, m);
    if ((st = M->tangent(rows, cols, p->x, 1, size, g, work)) != ROLN_OK) return st;
    for (i = 0; i < size; i++)
        top = ROLN_MAX(top, ROLN_ABS(g[i]));
    for (i = 0; i < size; i++) /* a large X makes a gradient X G X so long that its square is not finite */
        g[i] *= top > ROLN_SPD_TRACE ? ROLN_SPD_TRACE / top : 1;
    v = M->inner ? M->inner(rows, cols, p->x, g, g) : roln_dot(size, g, g);
    v = o->beta2 * *p->mom.v + (1 - o->beta2) * v;
    v_max = v > *p->mom.v_max ? v : *p->mom.v_max;
    for (i = 0; i < size; i++)
        m[i] = o->beta1 * m[i] + (1 - o->beta1) * g[i];
    keep[2 * size] = v;
    keep[2 * size + 1] = v_max;
    st = rolni_reach(p->block, -(p->lr / r->adam.unbias1) / (ROLN_SQRT(v_max / r->adam.unbias2) + o->eps), p->x, m, keep, work);
    if (st != ROLN_OK) return st;
    return roln_all_finite(2 * size + 2, keep) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Riemannian Adam with AMSGrad (Becigneul and Ganea 2019) on the product of the blocks:
       g = scale grad (clipped) + decay x, made Riemannian
       m = beta1 m + (1 - beta1) g,   v = beta2 v + (1 - beta2) <g,g>,   v_max = max(v, v_max)
       x = R_x(-lr (m / (1 - beta1^t)) / (sqrt(v_max / (1 - beta2^t)) + eps)),   m carried to x when next used
   Where R_x does not take that step, a shorter one or none is made (rolni_reach).
   theta and grad share the layout of the table. scale: usually 1 / number of samples that were added to grad.
   work [roln_update_work]. ROLN_E_NOT_FINITE: a gradient, a setting or an output is not, or lr is negative; status of the verbs.
   Everything is computed and checked before anything is written: on a status other than ROLN_OK theta, state and moments are as
   they were. */
ROLN_FN roln_status roln_adam_update(int blocks, const roln_block *table, const roln_opt *opt, roln_real scale,
                                     const roln_real *grad, roln_real *theta, roln_adam *state, const roln_moments *moments,
                                     roln_real *work)
{
    const roln_real norm = rolni_grad_norm(blocks, table, opt, scale, grad);
    const int kept = rolni_keep_all(blocks, table);
    rolni_rule r;
    int write, b;
    if (!roln_finite(norm) || !roln_finite(opt->clip) || !roln_finite(opt->decay)) return ROLN_E_NOT_FINITE;
    for (b = 0; b < ROLN_GROUPS; b++)
        if (!roln_finite(opt->lr[b]) || opt->lr[b] < 0) return ROLN_E_NOT_FINITE;
    r.opt = opt, r.scale = opt->clip > 0 && norm > opt->clip ? scale * (opt->clip / norm) : scale;
    r.adam.t = state->t + 1;
    r.adam.unbias1 = 1 - opt->beta1 * (1 - state->unbias1);
    r.adam.unbias2 = 1 - opt->beta2 * (1 - state->unbias2);
    for (write = 0; write < 2; write++) {
        rolni_factor p;
        p.grad = grad, p.x = theta, p.keep = work, p.mom = *moments;
        for (b = 0; b < blocks; b++) {
            const int numbers = roln_block_moments(table + b);
            p.block = table + b;
            p.size = roln_block_size(p.block);
            p.lr = opt->lr[p.block->group];
            if (p.lr > 0 && p.size > 0) {
                roln_status st = ROLN_OK;
                if (p.block->manifold == ROLN_EUCLIDEAN) {
                    st = rolni_adam_flat(&r, &p, write);
                } else {
                    if (write) rolni_write_kept(&p);
                    else st = rolni_adam_curved(&r, &p, work + kept);
                    p.keep += rolni_keep(p.block);
                }
                if (st != ROLN_OK) return st;
            }
            p.grad += p.size, p.x += p.size;
            p.mom.m += p.size, p.mom.v += numbers, p.mom.v_max += numbers;
        }
    }
    *state = r.adam;
    return ROLN_OK;
}

/* ---- 6 large symmetric systems ---------------------------------------------------------------- */

/* Normal equations of hundreds to thousands of unknowns, as Gauss-Newton has them: sums of products, Cholesky, solve.
   One array S [n][n+1] holds two triangles, so that factors for several d cost neither the sums again nor a second array:
       C[i][j] = S[i][j],     j <= i    the symmetric matrix; the factorisation leaves it as it is
       U[i][j] = S[i][j + 1], j >= i    its factor: C + diag(d) = U^T U
   Order 3, the third sum order: each ROLNI_SUM products are summed from 0, index ascending; these sums are added to the output one
   after the other. The same bits everywhere, and a long sum in float is off by (ROLNI_SUM + k / ROLNI_SUM) eps instead of k eps.
   How it is made: strips of ROLNI_COLS columns, [p][column], are copied together, so that they fit the caches; columns beyond the
   end are 0. From two strips a tile of ROLNI_ROWS x ROLNI_COLS outputs is summed in registers.
   Work is best aligned to 64 bytes. */
#define ROLNI_SUM 128

#if ROLN_SIMD
#ifdef __AVX512F__
#define ROLNI_ROWS 8
#define ROLNI_TILE(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7)
#else
#define ROLNI_ROWS 4
#define ROLNI_TILE(X) X(0) X(1) X(2) X(3)
#endif
#define ROLNI_COLS (2 * ROLNI_LANES)
#define ROLNI_GROUP (ROLNI_AS(int, 2048 / sizeof(roln_real))) /* columns that stay in the L2 cache as strips */
typedef roln_real rolni_v4 __attribute__((__vector_size__(4 * sizeof(roln_real)), __aligned__(sizeof(roln_real)), __may_alias__));
#define ROLNI_LD4(p) ROLNI_LDT(rolni_v4, p)
#define ROLNI_ST4(p, v) ROLNI_STT(rolni_v4, p, v)
#else
#define ROLNI_ROWS 4
#define ROLNI_LANES 1
#define ROLNI_COLS 4
#define ROLNI_GROUP 16
typedef roln_real rolni_w;
#define ROLNI_LDW(p) (*(p))
#define ROLNI_STW(p, v) (*(p) = (v))
#endif

/* One tile: c[r][j] = (add ? c[r][j] : 0) + sum_p a[p][r] b[p][j], p < k <= ROLNI_SUM, r < ROLNI_ROWS, j < ROLNI_COLS. Rows of a
   and of b are ROLNI_COLS apart, rows of c ld. */
#if ROLN_SIMD
/* narrow: the left half of the columns. */
ROLNI_INLINE void rolni_half_tile(int k, const roln_real *a, const roln_real *b, int narrow, int add, roln_real *c, size_t ld)
{
    const int w = ROLNI_LANES;
#define ROLNI_X(r) rolni_w c##r = {0}, d##r = {0};
    ROLNI_TILE(ROLNI_X)
#undef ROLNI_X
    for (; k > 0; k--, a += 2 * w, b += 2 * w) {
        const rolni_w b0 = ROLNI_LDW(b), b1 = narrow ? b0 : ROLNI_LDW(b + w);
#define ROLNI_X(r) \
        c##r += a[r] * b0; \
        if (!narrow) d##r += a[r] * b1;
        ROLNI_TILE(ROLNI_X)
#undef ROLNI_X
    }
#define ROLNI_X(r) \
    if (add) c##r += ROLNI_LDW(c + r * ld), d##r += ROLNI_LDW(c + r * ld + w); \
    ROLNI_STW(c + r * ld, c##r); \
    if (!narrow) ROLNI_STW(c + r * ld + w, d##r);
    ROLNI_TILE(ROLNI_X)
#undef ROLNI_X
}

/* Inlined, gcc 12 keeps what the loop counts in vector registers. */
ROLN_CODE static __attribute__((__noinline__, __unused__)) void rolni_tile(int k, const roln_real *a, const roln_real *b, int add,
                                                                   roln_real *c, size_t ld)
{
    rolni_half_tile(k, a, b, 0, add, c, ld);
}
#else
ROLN_FN void rolni_tile(int k, const roln_real *a, const roln_real *b, int add, roln_real *c, size_t ld)
{
#define ROLNI_X(r) roln_real c##r = 0, d##r = 0, e##r = 0, f##r = 0;
    ROLNI_X(0) ROLNI_X(1) ROLNI_X(2) ROLNI_X(3)
#undef ROLNI_X
    for (; k > 0; k--, a += 4, b += 4) {
        rolni_two u, v;
        ROLNI_LD2(u, b), ROLNI_LD2(v, b + 2);
#define ROLNI_X(r) c##r += a[r] * u.x[0], d##r += a[r] * u.x[1], e##r += a[r] * v.x[0], f##r += a[r] * v.x[1];
        ROLNI_X(0) ROLNI_X(1) ROLNI_X(2) ROLNI_X(3)
#undef ROLNI_X
    }
#define ROLNI_X(r) \
    if (add) c##r += c[0], d##r += c[1], e##r += c[2], f##r += c[3]; \
    c[0] = c##r, c[1] = d##r, c[2] = e##r, c[3] = f##r, c += ld;
    ROLNI_X(0) ROLNI_X(1) ROLNI_X(2) ROLNI_X(3)
#undef ROLNI_X
}
#endif

/* ROLNI_ROWS x ROLNI_COLS numbers at c, rows ld apart, will soon be wanted. */
ROLNI_INLINE void rolni_ahead(const roln_real *c, size_t ld)
{
#if ROLN_SIMD
    int r;
    for (r = 0; r < ROLNI_ROWS; r++, c += ld)
        __builtin_prefetch(c), __builtin_prefetch(c + ROLNI_LANES), __builtin_prefetch(c + ROLNI_COLS - 1);
#else
    (void)c, (void)ld;
#endif
}

/* b[p][r] = A[r][p], r < 4: columns of a strip from rows of A, ld apart, for p below what is returned. */
ROLNI_INLINE int rolni_turn(int k, const roln_real *A, size_t ld, roln_real *b)
{
    int p = 0;
#ifdef ROLNI_SHUFFLE
    for (; p < k - k % 4; p += 4, A += 4, b += 4 * ROLNI_COLS) {
        const rolni_v4 s = ROLNI_LD4(A), t = ROLNI_LD4(A + ld), u = ROLNI_LD4(A + 2 * ld), v = ROLNI_LD4(A + 3 * ld);
        const rolni_v4 su = ROLNI_SHUFFLE(s, u, 0, 4, 1, 5), tv = ROLNI_SHUFFLE(t, v, 0, 4, 1, 5);
        const rolni_v4 su2 = ROLNI_SHUFFLE(s, u, 2, 6, 3, 7), tv2 = ROLNI_SHUFFLE(t, v, 2, 6, 3, 7);
        ROLNI_ST4(b, ROLNI_SHUFFLE(su, tv, 0, 4, 1, 5));
        ROLNI_ST4(b + ROLNI_COLS, ROLNI_SHUFFLE(su, tv, 2, 6, 3, 7));
        ROLNI_ST4(b + 2 * ROLNI_COLS, ROLNI_SHUFFLE(su2, tv2, 0, 4, 1, 5));
        ROLNI_ST4(b + 3 * ROLNI_COLS, ROLNI_SHUFFLE(su2, tv2, 2, 6, 3, 7));
    }
#else
    (void)k, (void)A, (void)ld, (void)b;
#endif
    return p;
}

/* P = strips of n columns, B[p][j] = A[p][j], or A[j][p] if turned, p < k: P[strip][p][column]. Rows of A are ld apart. */
ROLN_FN void rolni_pack(int k, int n, int turned, const roln_real *A, size_t ld, roln_real *P)
{
    const int w = ROLNI_COLS;
    int j, p, q, done = 0;
    for (j = 0; j < n && !turned; j += w)
        for (p = 0; p < k; p++, P += w) {
            const roln_real *a = A + ROLNI_AS(size_t, p) * ld + j;
            if (n - j >= w) rolni_copy(w, a, P);
            else rolni_zero(w, P), rolni_copy(n - j, a, P);
        }
    for (j = 0; j < n && turned; j += w, P += k * w)
        for (q = 0; q < w; q++) {
            const roln_real *a = A + ROLNI_AS(size_t, j + q) * ld;
            if (q % 4 == 0) done = q + 3 < n - j ? rolni_turn(k, a, ld, P + q) : 0;
            for (p = done; p < k; p++)
                P[p * w + q] = q < n - j ? a[p] : 0;
        }
}

/* C[i][j] += sum_p P[p][i - i0] Q[p][j - j0], rows i0.. i0 + m - 1, columns j0.. j0 + n - 1 of one strip Q; j <= i. */
typedef struct {
    int k, i0, m;         /* terms, rows */
    const roln_real *P;   /* strips of the rows */
    roln_real *S, *t;     /* t: a tile */
    size_t ld;            /* of S */
    const roln_real *A;   /* what will be copied next: ahead rows at A, lda apart, of ROLNI_COLS numbers */
    size_t lda;
    int ahead;
} rolni_sums;

ROLN_FN void rolni_sums_strip(const rolni_sums *g, int j0, int n, const roln_real *Q)
{
    const int w = ROLNI_COLS;
    int i = j0 > g->i0 ? j0 - g->i0 : 0, j, r;
    for (i -= i % ROLNI_ROWS; i < g->m; i += ROLNI_ROWS) {
        const roln_real *a = g->P + i / w * g->k * w + i % w;
        const int below = g->i0 + i - j0; /* row i has below + 1 columns */
        roln_real *c = g->S + ROLNI_AS(size_t, g->i0 + i) * g->ld + j0;
        if (i < g->ahead) rolni_ahead(g->A + ROLNI_AS(size_t, i) * g->lda, g->lda);
        if (n == w && below + 1 >= w && g->m - i >= ROLNI_ROWS) {
            rolni_ahead(c, g->ld);
            rolni_tile(g->k, a, Q, 1, c, g->ld);
            continue;
        }
#if ROLN_SIMD
        if (below + ROLNI_ROWS <= ROLNI_LANES) rolni_half_tile(g->k, a, Q, 1, 0, g->t, ROLNI_COLS);
        else
#endif
            rolni_tile(g->k, a, Q, 0, g->t, ROLNI_COLS);
        for (r = 0; r < ROLNI_ROWS && r < g->m - i; r++, c += g->ld)
            for (j = 0; j < n && j <= below + r; j++)
                c[j] += g->t[r * w + j];
    }
}

/* Both products: C += B^T B, B [k][n] is A, or A^T if turned. */
#define ROLN_SYM_MEM(X) X(P, ROLNI_GROUP * ROLNI_SUM) X(Q, ROLNI_COLS * ROLNI_SUM) X(t, ROLNI_ROWS * ROLNI_COLS)
#define ROLN_SYM_WORK (0 ROLN_SYM_MEM(ROLNI_SIZE))
ROLN_FN void rolni_sym_sums(int k, int n, int turned, int from, int to, const roln_real *A, roln_real *S, roln_real *work)
{
    const size_t lda = ROLNI_AS(size_t, turned ? k : n), term = turned ? 1 : lda, column = turned ? lda : 1;
    const int w = ROLNI_COLS;
    int left = (to - from + ROLNI_GROUP - 1) / ROLNI_GROUP, i, m, j, p;
    ROLN_SYM_MEM(ROLNI_CARVE)
    for (i = from; i < to; i += m, left--) { /* groups of rows, about equal */
        m = ((to - i + left - 1) / left + w - 1) / w * w;
        m = m < to - i ? m : to - i;
        for (p = 0; p < k; p += ROLNI_SUM) {
            const roln_real *const a = A + ROLNI_AS(size_t, p) * term, *const rows = a + ROLNI_AS(size_t, i) * column;
            rolni_sums g = {k - p < ROLNI_SUM ? k - p : ROLNI_SUM, i, m, P, S, t, ROLNI_AS(size_t, n) + 1, a, lda, 0};
            rolni_pack(g.k, m, turned, rows, lda, P);
            for (j = 0; j < i + m; j += w) {
                const int n_j = i + m - j < w ? i + m - j : w;
                const roln_real *strip = P + (j - i) * g.k; /* one of the rows' own, or a copy */
                if (j < i || (j - i) % w != 0) {
                    rolni_pack(g.k, n_j, turned, a + ROLNI_AS(size_t, j) * column, lda, Q);
                    strip = Q;
                    g.A = a + j + w, g.ahead = !turned && j + w < i ? g.k : 0;
                } else {
                    g.A = rows + ROLNI_SUM + (j - i), g.ahead = turned && p + ROLNI_SUM + j - i < k && j - i < ROLNI_SUM ? m : 0;
                }
                rolni_sums_strip(&g, j, n_j, strip);
            }
        }
    }
}

/* C += A^T A, A [k][n]: k rows of a Jacobian with n parameters. Of C the rows from.. to - 1, all of them with 0, n. Calls for other
   rows may run at the same time, each with its own work: to halve the sums, divide at 7 n / 10. Every C[i][j] is the same bit for
   bit, however its rows are divided among calls; how the k rows of A are divided is part of order 3: blocks of a multiple of
   ROLNI_SUM give the bits of all at once. A may not overlap S. k n^2 / 2 multiply-adds, best with k of 256 or more. */
ROLN_FN void roln_sym_at(int k, int n, int from, int to, const roln_real *A, roln_real *S, roln_real *work)
{
    rolni_sym_sums(k, n, 0, from, to, A, S, work);
}

/* C += A A^T, A [n][k]: the dual matrix of n rows with k parameters. Otherwise as above; the same bits for A transposed. */
ROLN_FN void roln_sym_bt(int n, int k, int from, int to, const roln_real *A, roln_real *S, roln_real *work)
{
    rolni_sym_sums(k, n, 1, from, to, A, S, work);
}

/* X, strips of columns j0.. j0 + n - 1, minus sum_p U[p][i0 + i] U[p][j0 + j], p < i0, i < m, in order 3. */
ROLN_FN void rolni_sym_above(int i0, int m, int j0, int n, const roln_real *U, size_t ld, roln_real *X, roln_real *P, roln_real *Q,
                             roln_real *t)
{
    const int w = ROLNI_COLS;
    int p, i, j, r;
    for (p = 0; p < i0; p += ROLNI_SUM, U += ROLNI_SUM * ld) {
        rolni_pack(ROLNI_SUM, m, 0, U + i0, ld, P);
        for (j = 0; j < n; j += w) {
            roln_real *x = X + j * m;
            rolni_pack(ROLNI_SUM, n - j < w ? n - j : w, 0, U + j0 + j, ld, Q);
            for (i = 0; i < m; i += ROLNI_ROWS) {
                if (j + w < n) rolni_ahead(U + ROLNI_AS(size_t, i) * ld + j0 + j + w, ld); /* of the next Q */
                rolni_tile(ROLNI_SUM, P + i / w * ROLNI_SUM * w + i % w, Q, 0, t, ROLNI_COLS);
                for (r = 0; r < ROLNI_ROWS * w && r < (m - i) * w; r += ROLNI_LANES, x += ROLNI_LANES)
                    ROLNI_STW(x, ROLNI_LDW(x) - ROLNI_LDW(t + r));
            }
        }
    }
}

/* X[i] <- (X[i] - sum_p U[p][i] X[p]) / U[i][i], p < i, in order 3, for ROLNI_ROWS rows i = r.. of the m of a strip X; those above
   are done. D: strips of the m x m factor, inv [m]: 1 / U[i][i]. If pivots, X is the strip of D that holds the diagonal of these
   rows, and inv is made here: ROLN_E_NOT_SPD. */
ROLN_FN roln_status rolni_sym_rows(int m, int r, int pivots, const roln_real *D, roln_real *inv, roln_real *X, roln_real *t)
{
    const int w = ROLNI_COLS, end = m - r < ROLNI_ROWS ? m : r + ROLNI_ROWS;
    const roln_real *d = D + r / w * m * w;
    int i, j, p;
    rolni_tile(r, d + r % w, X, 0, t, ROLNI_COLS);
    for (i = r; i < end; i++, t += w) {
        roln_real *x = X + i * w, root = 0;
        for (j = 0; j < w; j += ROLNI_LANES) {
            rolni_w s = ROLNI_LDW(t + j);
            for (p = r; p < i; p++)
                s += d[p * w + i % w] * ROLNI_LDW(X + p * w + j);
            ROLNI_STW(x + j, ROLNI_LDW(x + j) - s);
        }
        if (pivots) {
            if (!(x[i % w] > 0) || !roln_finite(x[i % w]))
                return ROLN_E_NOT_SPD;
            root = ROLN_SQRT(x[i % w]);
            inv[i] = 1 / root;
        }
        for (j = 0; j < w; j += ROLNI_LANES)
            ROLNI_STW(x + j, ROLNI_LDW(x + j) * inv[i]);
        if (pivots) x[i % w] = root;
    }
    return ROLN_OK;
}

/* The m rows of strips X of n columns at column j0, as above. The first group of columns, own, holds the factor D of the rows in
   its first m columns. */
ROLN_FN roln_status rolni_sym_block(int m, int n, int own, const roln_real *D, roln_real *inv, roln_real *X, roln_real *t)
{
    const int w = ROLNI_COLS;
    roln_status st;
    int i, j;
    for (i = 0; i < m && own; i += ROLNI_ROWS)
        for (j = i - i % w; j < m; j += w)
            if ((st = rolni_sym_rows(m, i, j <= i, X, inv, X + j * m, t)) != ROLN_OK)
                return st;
    for (j = own ? m : 0; j < n; j += w)
        for (i = 0; i < m; i += ROLNI_ROWS)
            (void)rolni_sym_rows(m, i, 0, own ? X : D, inv, X + j * m, t);
    return ROLN_OK;
}

/* U: C + diag(d) = U^T U, d [n]: damping. S [n][n+1] as above; C remains. ROLNI_SUM rows of U after the other, in groups of
   columns: minus the rows above, then the rows themselves.
   ROLN_E_NOT_SPD if a pivot is not positive or not finite; then U holds no result. n^3 / 6 multiply-adds. */
#define ROLNI_SYM_M(n) ((n) < ROLNI_SUM ? (n) : ROLNI_SUM)
#define ROLNI_SYM_N ROLN_MAX(ROLNI_SUM, ROLNI_GROUP) /* columns of a group: the m x m factor is within the first */
#define ROLNI_SYM_UP(n) (((n) + ROLNI_COLS - 1) / ROLNI_COLS * ROLNI_COLS)
#define ROLN_SYM_CHOL_MEM(X, n) \
    X(x, ROLNI_SYM_M(n) * ((n) < ROLNI_SYM_N ? ROLNI_SYM_UP(n) : ROLNI_SYM_N)) X(t, ROLNI_ROWS * ROLNI_COLS) \
    X(inv, ROLNI_SYM_M(n)) X(P, (n) <= ROLNI_SUM ? 0 : ROLNI_SUM * ROLNI_SUM) X(Q, (n) <= ROLNI_SUM ? 0 : ROLNI_COLS * ROLNI_SUM)
#define ROLN_SYM_CHOL_WORK(n) (0 ROLN_SYM_CHOL_MEM(ROLNI_SIZE, n))
ROLN_FN roln_status roln_sym_chol(int n, const roln_real *d, roln_real *S, roln_real *work)
{
    const size_t ld = ROLNI_AS(size_t, n) + 1;
    const int w = ROLNI_COLS;
    int i0, m, j0, n_j, i, j;
    ROLN_SYM_CHOL_MEM(ROLNI_CARVE, n)
    for (i0 = 0; i0 < n; i0 += m) {
        m = ROLNI_SYM_M(n - i0);
        for (j0 = i0; j0 < n; j0 += n_j) {
            roln_real *const u = S + 1 + ROLNI_AS(size_t, i0) * ld;
            n_j = n - j0 < ROLNI_SYM_N ? n - j0 : ROLNI_SYM_N;
            rolni_pack(m, n_j, 1, S + ROLNI_AS(size_t, j0) * ld + i0, ld, x);
            for (i = 0; i < m && j0 == i0; i++)
                x[i / w * m * w + i * w + i % w] += d[i0 + i];
            rolni_sym_above(i0, m, j0, n_j, S + 1, ld, x, P, Q, t);
            if (j0 > i0) rolni_pack(m, m, 0, u + i0, ld, P);
            if (rolni_sym_block(m, n_j, j0 == i0, P, inv, x, t) != ROLN_OK)
                return ROLN_E_NOT_SPD;
            for (j = 0; j < n_j; j += w)
                for (i = 0; i < m; i++) {
                    const int first = j0 + j < i0 + i ? i0 + i - (j0 + j) : 0, count = (n_j - j < w ? n_j - j : w) - first;
                    if (count > 0) rolni_copy(count, x + j * m + i * w + first, u + ROLNI_AS(size_t, i) * ld + j0 + j + first);
                }
        }
    }
    return ROLN_OK;
}

/* Solve (C + diag(d)) x = b with the factor in S: U^T y = b by the rows of U, order 1, then U x = y, order 2. x [n] may be b.
   n^2 multiply-adds. */
ROLN_FN void roln_sym_solve(int n, const roln_real *S, const roln_real *b, roln_real *x)
{
    const size_t ld = ROLNI_AS(size_t, n) + 1;
    int i, j;
    for (i = 0; i < n; i++)
        x[i] = b[i];
    for (i = 0; i < n; i++) {
        const roln_real *const u = S + 1 + ROLNI_AS(size_t, i) * ld, y = x[i] / u[i];
        x[i] = y;
        for (j = i + 1; j < n - (n - i - 1) % ROLNI_LANES; j += ROLNI_LANES)
            ROLNI_STW(x + j, ROLNI_LDW(x + j) - y * ROLNI_LDW(u + j));
        for (; j < n; j++)
            x[j] -= y * u[j];
    }
    for (i = n - 1; i >= 0; i--) {
        const roln_real *const u = S + 1 + ROLNI_AS(size_t, i) * ld + i;
        x[i] = (x[i] - roln_dot(n - i - 1, u + 1, x + i + 1)) / u[0];
    }
}

/* ---- 7 Gauss-Newton --------------------------------------------------------------------------- */

/* Riemannian Gauss-Newton on the product of the blocks, recursive. A step gets R fresh residuals r_k, data minus model, with rows
   J_k, the derivative of the model's number k by the P parameters. Older rows are not looked at again: they stay in two sums, where
   they fade by beta = 1 - 1 / memory from step to step,
       A <- beta A + J^T J,   G = beta rest + J^T r,   d = (A + s I)^-1 G,   x+ = R_x(rate d),   s = lambda tr(A) / P
   in the tangent space at x. rest = G - rate A d is what the rows still ask for at x+ if they are linear, the sum of J^T r there.
   So a step on linear rows is that on all rows so far at once, each weighted by beta^age (recursive least squares, Kalman 1960;
   damping, Levenberg 1944, Marquardt 1963). A ridge w [P] draws parameters to 0 (Tikhonov 1943): each step gets P more rows, of
   parameter i the row sqrt(w_i) e_i with the residual -sqrt(w_i) x_i,
       A <- .. + diag(w),   G = .. - w x
   They fade like all rows. roln_newton_accept does not count them. w must be finite, not negative, and 0 in blocks that are not
   Euclidean. If there are many more parameters than rows, P > 8 R, the smaller system in the rows is solved, without ridge. The
   last step d_old is then all that is remembered, mu = beta (Goldshlager et al. 2024):
       d = argmin |J d - r|^2 + s |d - mu d_old|^2 = mu d_old + J^T (J J^T + s I)^-1 (r - mu J d_old),   s = lambda tr(J J^T) / P
   A step is taken if along it the change of the rows is foretold better by J d than by no change,
       error = |r(x+) - (r - rate J d)| / |rate J d| <= 1,
   and lambda follows the error: it grows where that is above 0.17, and falls where it is below, or where a step changes so little
   that its error is rounding. A step that is not taken leaves everything but lambda as it was, except that it ends the memory of
   the system in the rows: damping only shortens d - mu d_old.

       roln_newton_rows              J and r, as they are measured, become those of the tangent space     once for new rows
       roln_newton_normal_equations  A, or J J^T                                                          once for new rows
       roln_newton_step              x+, and the residuals that are expected there                        again after a refusal
       roln_newton_accept            takes the residuals at x+: is the step taken?
       roln_newton_give_up           after the last of several tries, if none was taken and new rows follow

   J [R + 1][P] is the caller's: behind the rows stands what is carried from step to step, rest or d_old, 0 at first. All blocks
   must have the dot product of their coordinates for a metric (roln_manifold.inner NULL); weight decay and groups are none of a
   step's business: parameters that shall stay are left out of the table. */

typedef struct {
    roln_real memory; /* in steps; 1: of this step's rows alone */
    roln_real rate;   /* the part of d that a step goes: 1; less with a long memory in the system of the rows */
    roln_real cap;    /* residuals beyond cap times their mean size count linearly, as in Huber's loss; 0: none do */
    const roln_real *ridge; /* [P], see above; NULL: 0 */
} roln_newton_opt;
#define ROLN_NEWTON_OPT {8, 1, 5, NULL}

typedef struct {
    roln_real lambda; /* 0: no damping, and none is ever added */
    roln_real loss;   /* sum of squares of the R residuals at x, scaled as the cap asks */
    roln_real error;  /* of the last step that was taken */
    uint32_t taken, refused;
} roln_newton;
#define ROLN_NEWTON_START {ROLN_C(1e-2), 0, 0, 0, 0}

/* Numbers of a point. */
ROLN_FN int roln_product_size(int blocks, const roln_block *table)
{
    int b, sum = 0;
    for (b = 0; b < blocks; b++)
        sum += roln_block_size(table + b);
    return sum;
}

/* Size of the system: P, or R where P > 8 R. */
#define ROLN_NEWTON_SIDE(R, P) ((P) > 8 * (R) ? (R) : (P))

/* gm [count + 1][P]: count Euclidean gradients at x and a tangent elsewhere become Riemannian gradients and a tangent at x. work:
   the largest roln_manifold.work. ROLN_E_SHAPE: a block has a metric of its own; status of the verbs. */
ROLN_FN roln_status rolni_tangents(int blocks, const roln_block *table, const roln_real *x, int count, int P, roln_real *gm,
                                   roln_real *work)
{
    int b;
    for (b = 0; b < blocks; b++) {
        const roln_block *t = table + b;
        const int size = roln_block_size(t);
        if (t->manifold != ROLN_EUCLIDEAN && size > 0) {
            roln_status st;
            if (t->manifold->inner != NULL) return ROLN_E_SHAPE;
            if ((st = t->manifold->tangent(t->rows, t->cols, x, count, P, gm, work)) != ROLN_OK) return st;
        }
        x += size, gm += size;
    }
    return ROLN_OK;
}

/* J [R + 1][P], Euclidean rows and what is carried, becomes Riemannian at x; rows whose residual is beyond the bound are scaled by
   weight = sqrt(bound / |r|), and the residual with them, so that their square has the slope of Huber's loss. x [P] in; J, r [R] in
   and out; weight [R], 1 where nothing is scaled, and state->loss out. work: the largest roln_manifold.work. ROLN_E_NOT_FINITE: a
   row, a residual, their sum of squares or a setting is not; ROLN_E_RANGE: memory below 1. All is then as it was. ROLN_E_SHAPE: a
   block has a metric of its own; status of the verbs: J is then scratch, all else as it was. */
ROLN_FN roln_status roln_newton_rows(int blocks, const roln_block *table, const roln_newton_opt *opt, int R, const roln_real *x,
                                     roln_real *J, roln_real *r, roln_real *weight, roln_newton *state, roln_real *work)
{
    const int P = roln_product_size(blocks, table);
    double sum = 0, square = 0;
    roln_real bound;
    roln_status st;
    int k, i;
    for (k = 0; k < R; k++)
        sum += ROLNI_AS(double, ROLN_ABS(r[k]));
    bound = ROLNI_AS(roln_real, sum / R) * opt->cap;
    if (!roln_finite(roln_dot(R, r, r)) || !roln_finite(bound) || !roln_finite(opt->memory)) return ROLN_E_NOT_FINITE;
    if (opt->memory < 1) return ROLN_E_RANGE;
    for (k = 0; k <= R; k++)
        if (!roln_all_finite(P, J + ROLNI_AS(size_t, k) * ROLNI_AS(size_t, P))) return ROLN_E_NOT_FINITE;
    if ((st = rolni_tangents(blocks, table, x, R, P, J, work)) != ROLN_OK) return st;
    for (k = 0; k < R; k++) {
        const roln_real a = ROLN_ABS(r[k]), w = bound > 0 && a > bound ? ROLN_SQRT(bound / a) : 1;
        roln_real *row = J + ROLNI_AS(size_t, k) * ROLNI_AS(size_t, P);
        for (i = 0; i < P && w < 1; i++)
            row[i] *= w;
        r[k] *= w, weight[k] = w;
        square += ROLNI_AS(double, r[k]) * ROLNI_AS(double, r[k]);
    }
    state->loss = ROLNI_AS(roln_real, square);
    return ROLN_OK;
}

/* Rows from .. to - 1 of A, or of J J^T, in S [side][side + 1], as roln_sym_at and roln_sym_bt lay it out; 0, side or more: all. S
   in is that of the step before, 0 at first; what has faded below 1e-30 becomes 0, not denormal. Calls for other rows may run at
   the same time, each with work of its own. work [ROLN_SYM_WORK]. */
ROLN_FN void roln_newton_normal_equations(const roln_newton_opt *opt, int R, int P, int from, int to, const roln_real *J,
                                          roln_real *S, roln_real *work)
{
    const int side = ROLN_NEWTON_SIDE(R, P), end = ROLN_MIN(to, side);
    const roln_real beta = side == P ? 1 - 1 / opt->memory : 0;
    int i, j;
    for (i = from; i < end; i++) {
        roln_real *row = S + ROLNI_AS(size_t, i) * ROLNI_AS(size_t, side + 1);
        for (j = 0; j <= i; j++)
            row[j] = beta > 0 && ROLN_ABS(row[j]) > ROLN_C(1e-30) ? beta * row[j] : 0;
        if (side == P && opt->ridge) row[i] += opt->ridge[i];
    }
    if (side == P) roln_sym_at(R, P, from, end, J, S, work);
    else roln_sym_bt(R, P, from, end, J, S, work);
}

/* y += J^T t in order 3, t [R]. */
ROLN_FN void rolni_newton_back(int R, int P, const roln_real *J, const roln_real *t, roln_real *y, roln_real *part)
{
    int k, i, now;
    for (k = 0; k < R; k += now) {
        now = R - k < ROLNI_SUM ? R - k : ROLNI_SUM;
        rolni_zero(P, part);
        roln_mm_at(1, now, P, t + k, J + ROLNI_AS(size_t, k) * ROLNI_AS(size_t, P), part);
        for (i = 0; i < P; i++)
            y[i] += part[i];
    }
}

/* The rows, residuals and sums of a step. */
typedef struct {
    int R, P;
    const roln_real *J, *r; /* [R + 1][P], [R], of roln_newton_rows */
    roln_real *S;           /* [side][side + 1], of roln_newton_normal_equations; its factor is written there, too */
} roln_newton_system;

/* d [P] for one lambda, and what is carried on if it is gone, keep [P]: d, or rest by A d = G - s d. ROLN_E_NOT_SPD: too little
   damping. */
#define ROLN_NEWTON_SOLVE_MEM(X, side, P) X(damp, side) X(y, side) X(part, P)
#define ROLN_NEWTON_SOLVE_WORK(side, P) (0 ROLN_NEWTON_SOLVE_MEM(ROLNI_SIZE, side, P) + ROLN_SYM_CHOL_WORK(side))
ROLN_FN roln_status rolni_newton_solve(const roln_newton_opt *opt, const roln_newton_system *g, const roln_real *x,
                                       roln_real lambda, roln_real mu, roln_real *d, roln_real *keep, roln_real *work)
{
    const roln_real rate = opt->rate;
    const int R = g->R, P = g->P, side = ROLN_NEWTON_SIDE(R, P);
    const size_t row = ROLNI_AS(size_t, P);
    const roln_real *J = g->J, *carried = J + ROLNI_AS(size_t, R) * row;
    roln_real s = 0;
    roln_status st;
    int i;
    ROLN_NEWTON_SOLVE_MEM(ROLNI_CARVE, side, P)
    for (i = 0; i < side; i++)
        s += g->S[ROLNI_AS(size_t, i) * ROLNI_AS(size_t, side + 2)];
    s *= lambda / ROLNI_AS(roln_real, P);
    for (i = 0; i < side; i++)
        damp[i] = s;
    if ((st = roln_sym_chol(side, damp, g->S, work)) != ROLN_OK) return st;
    if (side == P) {
        for (i = 0; i < P; i++)
            y[i] = mu * carried[i];
        for (i = 0; i < P && opt->ridge; i++)
            y[i] -= opt->ridge[i] * x[i];
        rolni_newton_back(R, P, J, g->r, y, part);
        roln_sym_solve(side, g->S, y, d);
        for (i = 0; i < P; i++)
            keep[i] = rate * s * d[i] + (1 - rate) * y[i];
    } else {
        for (i = 0; i < R; i++)
            y[i] = g->r[i] - mu * roln_dot(P, J + ROLNI_AS(size_t, i) * row, carried);
        roln_sym_solve(side, g->S, y, y);
        for (i = 0; i < P; i++)
            d[i] = mu * carried[i];
        rolni_newton_back(R, P, J, y, d, part);
        rolni_copy(P, d, keep);
    }
    return ROLN_OK;
}

/* x+ = R_x(rate d), block by block; u [P] scratch. */
ROLN_FN roln_status rolni_newton_move(int blocks, const roln_block *table, roln_real rate, const roln_real *x, const roln_real *d,
                                      roln_real *u, roln_real *next, roln_real *work)
{
    int b, i, at = 0;
    for (b = 0; b < blocks; b++) {
        const roln_block *t = table + b;
        const int size = roln_block_size(t);
        for (i = at; i < at + size; i++)
            u[i] = t->manifold == ROLN_EUCLIDEAN ? x[i] + rate * d[i] : rate * d[i];
        if (t->manifold == ROLN_EUCLIDEAN || size == 0) {
            rolni_copy(size, u + at, next + at);
        } else {
            roln_status st = t->manifold->retract(t->rows, t->cols, x + at, u + at, next + at, work);
            if (st == ROLN_E_RANGE) st = rolni_reach(t, rate, x + at, d + at, next + at, work);
            if (st != ROLN_OK) return st;
        }
        at += size;
    }
    return roln_all_finite(at, next) ? ROLN_OK : ROLN_E_NOT_FINITE;
}

/* Work of a step: of the solution, and of the hungriest manifold (verb). */
#define ROLN_NEWTON_STEP_MEM(X, P) X(d, P) X(u, P)
#define ROLN_NEWTON_STEP_WORK(R, P, verb) \
    (0 ROLN_NEWTON_STEP_MEM(ROLNI_SIZE, P) + ROLN_MAX(ROLN_NEWTON_SOLVE_WORK(ROLN_NEWTON_SIDE(R, P), P), verb))

/* A step from x [P]: where it ends, next [P]; the residuals there if they are linear, expect [R]; what takes the place of row R of
   J if it is taken, keep [P]. If the system is not positive definite to working precision, or the step leaves a manifold, more
   damping is tried, 8 times as much and 24 times at most, and d_old is dropped; lambda keeps it. ROLN_E_NOT_SPD: no damping
   helped, or lambda is 0 and the rows have lost rank; ROLN_E_NOT_FINITE: a setting or an output is not; ROLN_E_RANGE: memory below
   1; ROLN_E_SHAPE: a block has a metric of its own; status of the verbs. next, expect and keep are then scratch, and state is as it
   was; x, J, r and the sums are in any case. work [ROLN_NEWTON_STEP_WORK]. */
ROLN_FN roln_status roln_newton_step(int blocks, const roln_block *table, const roln_newton_opt *opt, const roln_newton_system *g,
                                     const roln_real *x, roln_newton *state, roln_real *next, roln_real *expect, roln_real *keep,
                                     roln_real *work)
{
    const int R = g->R, P = g->P, sums = ROLN_NEWTON_SIDE(R, P) == P;
    const roln_real beta = 1 - 1 / opt->memory;
    roln_real lambda = state->lambda;
    roln_status st = ROLN_E_NOT_SPD;
    int k, tries;
    ROLN_NEWTON_STEP_MEM(ROLNI_CARVE, P)
    if (!(lambda >= 0) || !roln_finite(lambda) || !roln_finite(opt->rate) || !roln_finite(opt->memory)) return ROLN_E_NOT_FINITE;
    if (opt->memory < 1) return ROLN_E_RANGE;
    for (tries = 0; tries < 24; tries++) {
        st = rolni_newton_solve(opt, g, x, lambda, sums || tries == 0 ? beta : 0, d, keep, work);
        if (st == ROLN_OK && sums && beta > 0) st = rolni_tangents(blocks, table, x, 0, P, d, work); /* older rows were elsewhere */
        if (st == ROLN_OK) st = rolni_newton_move(blocks, table, opt->rate, x, d, u, next, work);
        if (st == ROLN_OK || !(lambda > 0)) break;
        lambda *= 8;
    }
    if (st != ROLN_OK) return st;
    for (k = 0; k < R; k++)
        expect[k] = g->r[k] - opt->rate * roln_dot(P, g->J + ROLNI_AS(size_t, k) * ROLNI_AS(size_t, P), d);
    if (!roln_all_finite(R, expect) || !roln_all_finite(P, keep)) return ROLN_E_NOT_FINITE;
    state->lambda = lambda;
    return ROLN_OK;
}

/* Nonzero if the step is to be taken. The first R rows judge, all or fewer: r and weight [R] of roln_newton_rows, expect [R] of
   roln_newton_step, and there [R], the residuals at x+ as they are measured. If the step is taken, the caller copies next to x,
   and keep to row R of J; if not, the caller zeroes row R in the system of the rows, P > 8 R. lambda *= error / 0.17, but by 1/3 to
   2, and by 4 if the step is not taken; by 1/3 if it foretold a change of the rows by less than a thousandth, where error is
   rounding and more damping would lead ever deeper into it. It stays between eps and 1 / eps. */
ROLN_FN int roln_newton_accept(int R, const roln_real *r, const roln_real *weight, const roln_real *expect, const roln_real *there,
                               roln_newton *state)
{
    double wrong = 0, change = 0, all = 0;
    roln_real factor = 4;
    int k, take;
    for (k = 0; k < R; k++) {
        const roln_real a = weight[k] * there[k] - expect[k], b = r[k] - expect[k];
        wrong += ROLNI_AS(double, a * a), change += ROLNI_AS(double, b * b), all += ROLNI_AS(double, r[k] * r[k]);
    }
    take = roln_finite(ROLNI_AS(roln_real, wrong + change)) && wrong <= change;
    if (take) {
        state->error = change > 0 ? ROLN_SQRT(ROLNI_AS(roln_real, wrong / change)) : 0;
        factor = ROLN_MIN(ROLN_MAX(state->error / ROLN_C(0.17), 1 / ROLN_C(3.0)), 2);
    }
    if (change < 1e-6 * all) factor = 1 / ROLN_C(3.0);
    if (state->lambda > 0) state->lambda = ROLN_MIN(ROLN_MAX(state->lambda * factor, ROLN_EPS), 1 / ROLN_EPS);
    if (take) state->taken++;
    else state->refused++;
    return take;
}

/* Call it if all tries were refused and new rows follow: the refused rows may have been unusual. before: lambda before the tries.
   lambda becomes at most 4 `before`, and at most 1, but never less than `before`; a lambda that is smaller stays. */
ROLN_FN void roln_newton_give_up(roln_real before, roln_newton *state)
{
    state->lambda = ROLN_MIN(state->lambda, ROLN_MAX(before, ROLN_MIN(4 * before, 1)));
}

/* ---- 8 limited memory ------------------------------------------------------------------------- */

/* Riemannian L-BFGS on the product of the blocks (Nocedal 1980; Huang, Absil, Gallivan 2015): the direction -H g, with H from the
   last m pairs of steps s and changes of the gradient y, all carried to the tangent space at x by the verb tangent; a step along
   it, by halves and by parabolas, until the value falls by 1e-4 of what the slope promises (Armijo). For values that are the same
   each time they are asked for: a loss over fixed data. Blocks must have the dot product of their coordinates for a metric. */

/* The value at x, and its Euclidean gradient g [P]. Not finite: there is none at x. */
typedef roln_real (*roln_value)(void *ctx, const roln_real *x, roln_real *g);

typedef struct {
    roln_real first;  /* length of the very first step, and of one after a failure */
    roln_real value;  /* at x */
    roln_real length; /* of the last step */
    int pairs, newest;
    uint32_t t; /* steps taken */
} roln_lbfgs;
#define ROLN_LBFGS_START {ROLN_C(0.1), 0, 0, 0, 0, 0}

/* What a minimisation keeps: the Riemannian gradient and the pairs. */
#define ROLN_LBFGS_KEEP_MEM(X, m, P) X(g, P) X(pair, 2 * (m) * (P)) /* [m][s, y] */
#define ROLN_LBFGS_KEEP(m, P) (0 ROLN_LBFGS_KEEP_MEM(ROLNI_SIZE, m, P))

/* d = -H g by the two loops, newest pair first; a [m] scratch. */
ROLN_FN void rolni_lbfgs_direction(int m, int P, const roln_lbfgs *state, const roln_real *g, const roln_real *pair, roln_real *a,
                                   roln_real *d)
{
    int k, i, j;
    for (i = 0; i < P; i++)
        d[i] = -g[i];
    for (k = 0; k < state->pairs; k++) {
        const roln_real *s = pair + ROLNI_AS(size_t, (state->newest - k + m) % m) * 2 * ROLNI_AS(size_t, P), *y = s + P;
        a[k] = roln_dot(P, s, d) / roln_dot(P, s, y);
        for (j = 0; j < P; j++)
            d[j] -= a[k] * y[j];
    }
    if (state->pairs > 0) { /* the newest pair gives the scale */
        const roln_real *s = pair + ROLNI_AS(size_t, state->newest) * 2 * ROLNI_AS(size_t, P), *y = s + P;
        const roln_real scale = roln_dot(P, s, y) / roln_dot(P, y, y);
        for (j = 0; j < P; j++)
            d[j] *= scale;
    }
    for (k = state->pairs - 1; k >= 0; k--) {
        const roln_real *s = pair + ROLNI_AS(size_t, (state->newest - k + m) % m) * 2 * ROLNI_AS(size_t, P), *y = s + P;
        const roln_real f = a[k] - roln_dot(P, y, d) / roln_dot(P, s, y);
        for (j = 0; j < P; j++)
            d[j] += f * s[j];
    }
}

/* Where a step ends. */
typedef struct {
    roln_real *gn, *d, *u, *next, *a;
    roln_real length, value; /* of d, at next */
} rolni_search;

/* The step from x: next, its value and its Euclidean gradient gn. */
ROLN_FN roln_status rolni_lbfgs_search(int blocks, const roln_block *table, int m, roln_value value, void *ctx, roln_lbfgs *state,
                                       const roln_real *x, const roln_real *keep, rolni_search *to, roln_real *work)
{
    enum { ROLNI_TRIES = 20 };
    const int P = roln_product_size(blocks, table);
    const roln_real *g = keep, *pair = keep + P;
    roln_status st = ROLN_OK;
    int tries;
    for (;;) { /* along -H g, and if that is in vain along -g */
        const int plain = state->pairs == 0;
        roln_real slope, e;
        rolni_lbfgs_direction(m, P, state, g, pair, to->a, to->d);
        slope = roln_dot(P, g, to->d);
        e = plain ? state->first / ROLN_SQRT(-slope) : 1;
        for (tries = 0; tries < ROLNI_TRIES && slope < 0; tries++) {
            roln_real f = 0, best = 0;
            st = rolni_newton_move(blocks, table, e, x, to->d, to->u, to->next, work);
            if (st == ROLN_OK) {
                rolni_zero(P, to->gn);
                f = value(ctx, to->next, to->gn);
                if (!roln_finite(f) || !roln_all_finite(P, to->gn)) st = ROLN_E_NOT_FINITE;
            }
            to->length = e, to->value = f;
            if (st == ROLN_OK && f < state->value && f <= state->value + ROLN_C(1e-4) * e * slope) return ROLN_OK;
            if (st == ROLN_OK) best = -slope * e * e / (2 * (f - state->value - e * slope)); /* the lowest point of a parabola */
            e = ROLN_MIN(ROLN_MAX(best, e / 10), e / 2);
        }
        if (plain) return !roln_finite(slope) ? ROLN_E_NOT_FINITE : st == ROLN_OK ? ROLN_E_NO_CONVERGENCE : st;
        state->pairs = 0;
    }
}

/* One step. x [P], keep [ROLN_LBFGS_KEEP] in and out. ROLN_E_NO_CONVERGENCE: no step along -g lowers the value, which is the end,
   where rounding decides; ROLN_E_NOT_FINITE: no value or gradient at x; ROLN_E_SHAPE: a metric of its own; status of the verbs. x
   is as it was unless ROLN_OK, and keep forgets its pairs. At most 40 values. work [ROLN_LBFGS_WORK], verb: the largest
   roln_manifold.work. */
#define ROLN_LBFGS_MEM(X, m, P) X(gn, P) X(step, P) /* behind gn */ X(d, P) X(u, P) X(next, P) X(a, m)
#define ROLN_LBFGS_WORK(m, P, verb) (0 ROLN_LBFGS_MEM(ROLNI_SIZE, m, P) + (verb))
ROLN_FN roln_status roln_lbfgs_step(int blocks, const roln_block *table, int m, roln_value value, void *ctx, roln_lbfgs *state,
                                    roln_real *x, roln_real *keep, roln_real *work)
{
    const int P = roln_product_size(blocks, table);
    roln_real *g = keep, *pair = keep + P, sy;
    rolni_search to = {NULL, NULL, NULL, NULL, NULL, 0, 0};
    roln_status st;
    int i, k;
    ROLN_LBFGS_MEM(ROLNI_CARVE, m, P)
    to.gn = gn, to.d = d, to.u = u, to.next = next, to.a = a;
    if (state->t == 0) {
        rolni_zero(P, g);
        state->value = value(ctx, x, g);
        if (!roln_finite(state->value) || !roln_all_finite(P, g)) return ROLN_E_NOT_FINITE;
        rolni_copy(P, g, gn), rolni_zero(P, step);
        if ((st = rolni_tangents(blocks, table, x, 1, P, gn, work)) != ROLN_OK) return st;
        rolni_copy(P, gn, g);
    }
    if ((st = rolni_lbfgs_search(blocks, table, m, value, ctx, state, x, keep, &to, work)) != ROLN_OK) return st;
    for (i = 0; i < P; i++)
        step[i] = to.length * d[i];
    st = rolni_tangents(blocks, table, next, 1, P, gn, work); /* and step */
    if (st == ROLN_OK) st = rolni_tangents(blocks, table, next, 0, P, g, work);
    for (k = 0; k < 2 * m && st == ROLN_OK; k++)
        if (k / 2 < state->pairs)
            st = rolni_tangents(blocks, table, next, 0, P,
                                pair + ROLNI_AS(size_t, (state->newest - k / 2 + m) % m * 2 + k % 2) * ROLNI_AS(size_t, P), work);
    if (st != ROLN_OK) {
        state->pairs = 0, state->t = 0;
        return st;
    }
    for (i = 0; i < P; i++)
        u[i] = gn[i] - g[i];
    sy = roln_dot(P, step, u);
    if (sy > ROLN_EPS * ROLN_SQRT(roln_dot(P, step, step) * roln_dot(P, u, u))) {
        state->newest = (state->newest + 1) % m;
        rolni_copy(P, step, pair + ROLNI_AS(size_t, 2 * state->newest) * ROLNI_AS(size_t, P));
        rolni_copy(P, u, pair + ROLNI_AS(size_t, 2 * state->newest + 1) * ROLNI_AS(size_t, P));
        state->pairs = ROLN_MIN(state->pairs + 1, m);
    }
    state->length = ROLN_SQRT(roln_dot(P, step, step));
    rolni_copy(P, next, x);
    rolni_copy(P, gn, g);
    state->value = to.value;
    state->t++;
    return ROLN_OK;
}

#endif
