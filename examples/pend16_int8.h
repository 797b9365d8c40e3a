/* pend16_int8.h - pend16.h with the weights of its autoencoder as int8, for the controller: written by store.c. */
#ifndef PEND16_INT8_H
#define PEND16_INT8_H

#define ROLN_NAME pend16_int8
#define ROLN_AE 16, 16, 16, 16, 12, 8, 4
#define ROLN_SLOPE 0.6
#define ROLN_MLP 64, 64
#define ROLN_STEP rk4
#define ROLN_STORE int8
#include "roln.h"

#endif
