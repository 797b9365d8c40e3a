/* SPDX-License-Identifier: MIT */
/* fuzz_calls.c - random calls of random models: the first bytes of an input choose a config, its numbers, and how odd these are;
   each pair behind them is a call of fuzz_model.h and how odd its numbers are. */
#include "roln_spd.h"
#include <math.h>
#include <stddef.h>
#include <string.h>
#include "fuzz.h"

#define MODEL plain
#define ROLN_AE 5, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_PLAN 3, 2
#include "fuzz_model.h"

#define MODEL bare /* no autoencoder; base point, midpoint */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_INTEGRATOR midpoint
#define ROLN_BASE 1
#define ROLN_PLAN 4, 2
#include "fuzz_model.h"

#define MODEL rich /* SPD layers, damping, inputs */
#define ROLN_AE 6, 5, 3
#define ROLN_MLP 4, 3
#define ROLN_LAYERS gyro, gyro
#define ROLN_BASE 1
#define ROLN_DAMPING 1
#define ROLN_INPUTS 2
#define ROLN_PLAN 3, 2
#define ROLN_LEARN everything
#include "fuzz_model.h"

#define MODEL delan
#define ROLN_AE 4, 2
#define ROLN_MLP 4
#define ROLN_MASS cholesky
#define ROLN_INTEGRATOR euler
#define ROLN_PLAN 3, 1
#include "fuzz_model.h"

#define MODEL chart
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 3
#define ROLN_LOAD 1
#define ROLN_PLAN 3, 2
#include "fuzz_model.h"

#define MODEL curved /* behind a layer with an activation; units of its own, damping */
#define ROLN_AE 6, 4, 3
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 2
#define ROLN_SCALE each
#define ROLN_DAMPING 1
#include "fuzz_model.h"

#define MODEL wheel /* angles, friction */
#define ROLN_AE 3
#define ROLN_MLP 4
#define ROLN_ANGLES 1, 0, 1
#define ROLN_SCALE each
#define ROLN_DAMPING 1
#define ROLN_FRICTION 1
#define ROLN_LOAD 1
#define ROLN_PLAN 3, 2
#include "fuzz_model.h"

#define MODEL pole /* one degree of freedom, linear layers, a servo drive in a fluid */
#define ROLN_AE 3, 1
#define ROLN_MLP 2
#define ROLN_SLOPE 1
#define ROLN_DAMPING 2
#define ROLN_FRICTION 2
#define ROLN_PLAN 3, 1
#include "fuzz_model.h"

#define MODEL late /* torques that act two ticks later, joints that stick */
#define ROLN_AE 2
#define ROLN_MLP 3
#define ROLN_FRICTION 1
#define ROLN_STICTION 1
#define ROLN_DELAY 2
#define ROLN_PLAN 3, 2
#include "fuzz_model.h"

#define MODEL servos /* that follow positions */
#define ROLN_AE 3
#define ROLN_MLP 3
#define ROLN_ACTUATOR servo
#include "fuzz_model.h"

#define MODEL led /* the motion of the last joint is prescribed */
#define ROLN_AE 3
#define ROLN_MLP 3
#define ROLN_DRIVEN 1
#include "fuzz_model.h"

#ifndef ROLN_DOUBLE
#define MODEL bytes
#define SIBLING plain
#define ROLN_AE 5, 4, 2
#define ROLN_MLP 5, 4
#define ROLN_PLAN 3, 2
#define ROLN_QUANTISE int8
#include "fuzz_model.h"

#define MODEL halves
#define SIBLING chart
#define ROLN_AE 5, 2
#define ROLN_MLP 4
#define ROLN_CHART polynomial, 3
#define ROLN_LOAD 1
#define ROLN_QUANTISE half
#include "fuzz_model.h"
#endif

typedef struct {
    void (*start)(int kind);
    void (*call)(unsigned byte);
} model;
#define OF(name) {name##_start_of, name##_call}
static const model models[] = {OF(plain), OF(bare), OF(rich), OF(delan), OF(chart), OF(curved),
                               OF(wheel), OF(pole), OF(late), OF(servos), OF(led),
#ifndef ROLN_DOUBLE
                               OF(bytes), OF(halves)
#endif
};

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    fuzz_input in = {data, data + size};
    const model *m = models + fuzz_byte(&in) % (sizeof models / sizeof *models);
    const int kind = (int)(fuzz_byte(&in) % 8);
    fuzz_now.odd = fuzz_byte(&in), fuzz_now.seed = fuzz_word(&in);
    m->start(kind > 4 ? 0 : kind);
    while (in.at + 1 < in.end) {
        const unsigned byte = fuzz_byte(&in);
        fuzz_now.odd = fuzz_byte(&in);
        m->call(byte);
    }
    return 0;
}
