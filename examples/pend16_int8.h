/* SPDX-License-Identifier: MIT */
/* pend16_int8.h - pend16.h with the weights of its autoencoder as int8, for the controller: written by quantise.c. */
#ifndef PEND16_INT8_H
#define PEND16_INT8_H

#define ROLN_NAME pend16_int8
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 32, 32
#define ROLN_INTEGRATOR rk4
#define ROLN_QUANTISE int8
#include "roln.h"

#endif
