/* SPDX-License-Identifier: MIT */
/* plan_inside.h - what is inside of NAME_plan_next, for every small model (called.h: CALLED_ALSO): the base and its derivatives,
   what the solver makes of them, and what a plan keeps of them. */
#ifndef PLAN_INSIDE_H
#define PLAN_INSIDE_H

/* Arrays of NAME_plan_next_work and of the plan that is kept: derivatives A, B, at the states and torques `at`. */
typedef struct {
    roln_real *s0, *u0, *A, *B, *Q, *q, *K, *r, *hold, *at, *to, *s, *u;
    roln_bits *of;
} plan_arrays;

typedef struct {
    void (*start)(const roln_goal *g, const plan_at *pl, const roln_real *s, void *work, plan_arrays *b);
    roln_status (*base)(const instance *m, const roln_goal *g, const plan_at *pl, roln_real *cost, int *in, void *work);
    roln_status (*solve)(const roln_goal *g, roln_real *gap, void *work);
    roln_status (*next)(const instance *m, const roln_goal *g, const roln_real *s, void *work, roln_plan *made);
    int (*expects)(const instance *m, int k, int of, roln_real *x, roln_real *d, void *work);
} plan_inside;

#endif

/* The plan that is kept from call to call. */
static C_(plan) C_(kept);

/* Scratch as NAME_plan_next has it at its start, from s on. */
ROLN_FN void C_(c_inside_start)(const roln_goal *g, const plan_at *pl, const roln_real *s, void *work, plan_arrays *b)
{
    C_(plan_next_work) *const w = (C_(plan_next_work) *)work;
    C_(plan) *const plan = &C_(kept);
    C_(c_plan)(pl, plan);
    copied(2 * C_(n), s, w->s0);
    C_(i_plan_start)(g, plan, w);
    b->s0 = w->s0, b->u0 = w->u0, b->A = plan->A, b->B = plan->B, b->Q = w->Q, b->q = w->q, b->K = w->K, b->r = w->r;
    b->hold = w->hold, b->at = plan->at, b->to = plan->to, b->s = plan->s[0].z, b->u = plan->u, b->of = plan->of;
}

/* pl NULL: u0 is there. */
ROLN_FN roln_status C_(c_inside_base)(const instance *m, const roln_goal *g, const plan_at *pl, roln_real *cost, int *in,
                                      void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(i_plan_base)(&p, g, &C_(kept), pl != NULL, cost, in, (C_(plan_next_work) *)work);
}

ROLN_FN roln_status C_(c_inside_solve)(const roln_goal *g, roln_real *gap, void *work)
{
    return C_(i_plan_solve)(g, &C_(kept), gap, (C_(plan_next_work) *)work);
}

/* NAME_plan_next of the plan that is kept; *made: what is known of it. */
ROLN_FN roln_status C_(c_inside_next)(const instance *m, const roln_goal *g, const roln_real *s, void *work, roln_plan *made)
{
    const C_(params) p = C_(c_params)(m);
    const C_(latent) at = C_(c_latent)(s, s + C_(n));
    const roln_status st = C_(plan_next)(&p, g, &at, &C_(kept), (C_(plan_next_work) *)work);
    *made = C_(kept).plan;
    return st;
}

/* Nonzero if the derivatives of step k that are kept, of a model `of`, serve model 1 at s0 and u0: x, d as of NAME_i_plan_near. */
ROLN_FN int C_(c_inside_expects)(const instance *m, int k, int of, roln_real *x, roln_real *d, void *work)
{
    const C_(params) p = C_(c_params)(m);
    C_(plan_next_work) *const w = (C_(plan_next_work) *)work;
    w->model = 1, C_(kept).of[k] = (roln_bits)of;
    return C_(i_plan_near)(&p, &C_(kept), k, w, x, d);
}

static const plan_inside C_(inside) = {.start = C_(c_inside_start), .base = C_(c_inside_base), .solve = C_(c_inside_solve),
                                       .next = C_(c_inside_next), .expects = C_(c_inside_expects)};
