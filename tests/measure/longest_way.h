/* SPDX-License-Identifier: MIT */
/* longest_way.h - the longest way through what depends on numbers, for a program that has defined ROLNI_EIG_SWEEPS as longest. */

/* Each eigen-decomposition asks here for its bound. Beside its own sweeps, as many as they are, it then takes all that it may, over
   the whole matrix, by NaN, which never converges; a sort that exchanges every row and one that finds a new least in every place;
   and the longer way through every divided difference of exp. That is all in a tick, a step and a tick of the filter that depends
   on numbers (tests/safety/steady.sh). longest_way: 1, 2: that way, without and with second derivatives. */
int longest_way;
volatile roln_real sum;
static int longest(int rows)
{
    enum { MOST = 16 };
    static roln_real l[MOST], e[MOST], Q[MOST * MOST], K3[MOST * MOST * MOST];
    const int second = longest_way == 2, way = longest_way;
    int i;
    if (way == 0) return ROLNI_EIG_MOST(rows);
    longest_way = 0;
    for (i = 0; i < rows; i++)
        l[i] = e[i] = rolni_real(ROLNI_INF | (ROLNI_INF >> 1));
    rolni_eig_iterate(rows, l, e, Q);
    for (i = 0; i < rows; i++)
        l[i] = ROLNI_AS(roln_real, (i + 1) % rows);
    rolni_eig_sort(rows, 1, l, Q);
    for (i = 0; i < rows; i++)
        l[i] = ROLNI_AS(roln_real, -i);
    rolni_eig_sort(rows, 1, l, Q);
    for (i = 0; i < rows * (rows - 1) / 2; i++)
        sum += roln_sinhc(ROLN_C(0.4));
    for (i = 0; i < rows && second; i++)
        l[i] = ROLN_C(0.01) * ROLNI_AS(roln_real, i);
    if (second) roln_exp_dd2(rows, l, Q, K3);
    longest_way = way;
    return ROLNI_EIG_MOST(rows);
}
