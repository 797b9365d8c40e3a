/* SPDX-License-Identifier: MIT */
/* sizes.h - the sizes that the macros of roln.h ask for, of a model that is known at run time only: behind
   `const struct sizes sz = sizes_of(model, nb)`, ROLN_STEP_WORK(SZ) is the scratch of roln_step. nb: windows of a block together.
   A model that is known at compile time has NAME_work and NAME_train. */
#ifndef SIZES_H
#define SIZES_H

#include "roln.h"

#define SZ(name) sz.name
#define SIZES_FIELD(name, size) int name;
#define SIZES_SET(name, size) sz.name = size;

struct sizes {
    int N, N1, N2, ae_sum, curves, bent, ae_size; /* roln_ae.h */
    int n, base, damping, cossin, cholesky, formed, hidden, wide, layers; /* roln_lnn.h */
    int inputs, force_size, scheme, own; /* roln.h */
    ROLN_LNN_ROWS(SIZES_FIELD, SZ) ROLN_GRAD_STEPS(SIZES_FIELD, SZ, nb)
};

ROLN_FN struct sizes sizes_of(const roln_model *model, int nb)
{
    const roln_ae *ae = &model->ae;
    const roln_lnn *f = &model->lnn;
    struct sizes sz = {0};
    sz.N = ae->size[0], sz.N1 = roln_ae_size(ae, 1), sz.N2 = roln_ae_size(ae, 2);
    sz.ae_sum = roln_ae_sum(ae), sz.ae_size = roln_ae_params(ae);
    sz.curves = ae->curves, sz.bent = roln_ae_bent(ae);
    sz.n = f->n, sz.base = f->base, sz.damping = f->damping;
    sz.cossin = rolni_cossin(f);
    sz.cholesky = f->mass == ROLN_CHOLESKY, sz.formed = rolni_formed(f), sz.hidden = roln_mlp_hidden(&f->mass_net);
    sz.wide = roln_mlp_widest(&f->mass_net, 0) + roln_mlp_widest(&f->mass_net, 1);
    sz.layers = f->layers;
    sz.inputs = model->inputs, sz.force_size = roln_force_size(model), sz.scheme = model->scheme, sz.own = model->own;
    ROLN_LNN_ROWS(SIZES_SET, SZ)
    ROLN_GRAD_STEPS(SIZES_SET, SZ, nb)
    return sz;
}

#endif
