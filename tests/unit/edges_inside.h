/* SPDX-License-Identifier: MIT */
/* edges_inside.h - D of the cost of the joints at z, for every small model (called.h: CALLED_ALSO). */
ROLN_FN roln_status C_(c_cost_joints)(const instance *m, const roln_cost *cost, const roln_real *z, roln_real *D, void *work)
{
    const C_(params) p = C_(c_params)(m);
    return C_(i_cost_joints)(&p, cost, z, D, (C_(i_cost_joints_work) *)work);
}
