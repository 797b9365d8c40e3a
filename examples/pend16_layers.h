/* SPDX-License-Identifier: MIT */
/* pend16_layers.h - pend16 with layers that bend in place of a chart: the autoencoder of the paper, for train.sh to compare. */
#ifndef PEND16_LAYERS_H
#define PEND16_LAYERS_H

#define ROLN_NAME pend16_layers
#define ROLN_AE 16, 16, 16, 16, 12, 8, 4 /* layers that keep their size bend without reducing */
#define ROLN_SLOPE 0.6
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR rk4
#define ROLN_HORIZON 25 /* half a second in steps of 20 ms */
#include "roln.h"

#endif
