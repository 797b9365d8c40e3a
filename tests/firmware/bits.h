/* SPDX-License-Identifier: MIT */
/* bits.h - between bits.c, whose kernels use the vectors of the core, and bits_plain.c, whose kernels are plain C. */
#ifndef BITS_H
#define BITS_H

#include "chain.h"
#include "chain_weights.h"

struct kernels {
    void (*mm)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);
    void (*mm_at)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);
    void (*mm_bt)(int m, int k, int n, const roln_real *A, const roln_real *B, roln_real *C);
    void (*softplus_n)(int n, const roln_real *a, roln_real *y, roln_real *s);
    void (*rotate)(int n, roln_real c, roln_real s, roln_real *x);
    void (*rotate2)(int n, roln_real c1, roln_real s1, roln_real c, roln_real s, roln_real *x);
    int (*all_finite)(int n, const roln_real *x);
    void (*mlp)(const roln_mlp *f, int value, int planes, int nb, const roln_real *theta, const roln_real *x, roln_real *y,
                roln_real *slope, roln_real *out);
    void (*mlp_gradient)(const roln_mlp *f, int planes, int nb, const roln_real *theta, const roln_real *slope, const roln_real *gy,
                         roln_real *ga, roln_real *gx, roln_real *work);
    uint32_t (*tick)(const chain_params *p, const roln_limits *limits, const chain_state *x, const chain_target *ref,
                     chain_latent *s, chain_guard *guard, chain_tick_work *work);
    roln_status (*step)(const chain_params *p, chain_latent *s, const roln_real *tau, roln_real dt, chain_step_work *work);
    roln_status (*decode)(const chain_params *p, const chain_latent *s, chain_state *x, chain_decode_work *work);
};

#define KERNELS {roln_mm, roln_mm_at, roln_mm_bt, roln_softplus_n, rolni_rotate, rolni_rotate2, roln_all_finite, roln_mlp_forward, \
                 roln_mlp_gradient, chain_tick, chain_step, chain_decode}

extern const struct kernels plain;

#endif
