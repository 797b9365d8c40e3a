/* SPDX-License-Identifier: MIT */
/* config.c - one row of configs.h, -DCONFIG=NAME: the model NAME and, if it is trained in POD coordinates, NAME_whole of all
   coordinates, which only predicts. */
#include <stddef.h>
#include <string.h>

#include "experiment.h"
#include "configs.h"

#define MODEL CONFIG
#define MODEL_AE COLUMN(AE_OF)
#define MODEL_LEARNS (ROLNI_BITS(COLUMN(STORE_OF)) == 0)
#include "on_model.h"

#if ROLNI_AT(0, COLUMN(WHOLE_OF)) > 0
#undef MODEL
#undef MODEL_AE
#undef MODEL_LEARNS
#define MODEL ROLNI_CAT(CONFIG, whole)
#define MODEL_AE COLUMN(WHOLE_OF)
#define MODEL_LEARNS 0
#include "on_model.h"
#endif
