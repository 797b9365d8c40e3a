/* SPDX-License-Identifier: MIT */
/* plan_inside.h - what is inside of NAME_plan_next, for every small model (called.h: CALLED_ALSO): the base and its derivatives,
   and what the solver makes of them. */
#ifndef PLAN_INSIDE_H
#define PLAN_INSIDE_H

/* Arrays of NAME_plan_next_work. */
typedef struct {
    roln_real *s0, *u0, *A, *B, *Q, *q, *K, *r, *hold;
} plan_arrays;

typedef struct {
    void (*start)(const roln_goal *g, const plan_at *pl, const roln_real *s, void *work, plan_arrays *b);
    roln_status (*base)(const instance *m, const roln_goal *g, const plan_at *pl, roln_real *cost, int *in, void *work);
    roln_status (*solve)(const roln_goal *g, roln_real *gap, void *work);
} plan_inside;

#endif

/* Scratch as NAME_plan_next has it at its start, from s on. */
ROLN_FN void C_(c_inside_start)(const roln_goal *g, const plan_at *pl, const roln_real *s, void *work, plan_arrays *b)
{
    C_(plan_next_work) *const w = (C_(plan_next_work) *)work;
    C_(plan) plan;
    C_(c_plan)(pl, &plan);
    copied(2 * C_(n), s, w->s0);
    C_(i_plan_start)(g, &plan, w);
    b->s0 = w->s0, b->u0 = w->u0, b->A = w->A, b->B = w->B, b->Q = w->Q, b->q = w->q, b->K = w->K, b->r = w->r, b->hold = w->hold;
}

/* pl NULL: u0 is there. */
ROLN_FN roln_status C_(c_inside_base)(const instance *m, const roln_goal *g, const plan_at *pl, roln_real *cost, int *in,
                                      void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(plan) plan;
    if (pl) C_(c_plan)(pl, &plan);
    return C_(i_plan_base)(&p, g, pl ? &plan : NULL, cost, in, (C_(plan_next_work) *)work);
}

ROLN_FN roln_status C_(c_inside_solve)(const roln_goal *g, roln_real *gap, void *work)
{
    return C_(i_plan_solve)(g, gap, (C_(plan_next_work) *)work);
}

static const plan_inside C_(inside) = {
    .start = C_(c_inside_start), .base = C_(c_inside_base), .solve = C_(c_inside_solve)};
