/* models.h - a large model with an autoencoder and a small one without: what warnings.sh and symbols.sh compile. */
#ifndef MODELS_H
#define MODELS_H

#define ROLN_NAME big
#define ROLN_AE 600, 128, 64, 32, 10
#define ROLN_MLP 64, 64
#include "../roln.h"

#define ROLN_NAME small
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_BASE 1
#define ROLN_STEP midpoint
#include "../roln.h"

#endif
