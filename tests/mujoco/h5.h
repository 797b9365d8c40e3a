/* SPDX-License-Identifier: MIT */
/* h5.h - truth_sets as HDF5: groups /train, /test and /tune, each with t, e_kin, e_pot [N,S]; q, qd, qdd, tau, tau_model
   [N,S,dof]; z, zd [N,S,latent] where there is a latent; all f64; attributes system, dt, dt_sim, stride, seed, mujoco_version,
   model_xml. The same sets give the same bytes. Both: 0, or -1 (HDF5 prints why); sets that were not read are left empty. */
#ifndef H5_H
#define H5_H

#include "truth.h"

int truth_h5_write(const char *path, const struct truth_set sets[TRUTH_SPLITS]);
int truth_h5_read(const char *path, struct truth_set sets[TRUTH_SPLITS]);

#endif
