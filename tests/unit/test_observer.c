/* SPDX-License-Identifier: MIT */
/* The observer with steady gains: gains against a covariance that settles in long double, a tick against its definition, faults,
   and errors beside those of the filter. */
#include "check.h"

/* An angle and a slider, in units of their own. */
#define ROLN_NAME cart
#define ROLN_AE 2
#define ROLN_SCALE each
#define ROLN_MLP 8
#define ROLN_ANGLES 1, 0
#define ROLN_INTEGRATOR leapfrog
#include "roln.h"

/* Behind a chart, with damping. */
#define ROLN_NAME sheet
#define ROLN_AE 5, 2
#define ROLN_MLP 8
#define ROLN_CHART polynomial, 2
#define ROLN_DAMPING 1
#define ROLN_INTEGRATOR leapfrog
#include "roln.h"

/* With dry friction. */
#define ROLN_NAME rough
#define ROLN_AE 3
#define ROLN_MLP 8
#define ROLN_FRICTION 1
#define ROLN_INTEGRATOR leapfrog
#include "roln.h"

/* Friction holds its joints: the observer takes the model's own step. */
#define ROLN_NAME held
#define ROLN_AE 2
#define ROLN_MLP 8
#define ROLN_FRICTION 1
#define ROLN_STICTION 1
#define ROLN_INTEGRATOR leapfrog
#include "roln.h"

#define CALLED(X) X(decode)
#include "small.h"

void TEST_NAME(observer)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

/* A velocity at which dry friction slides. */
#define SLIDE(NAME, count) \
    static void slide_##NAME(const NAME##_params *p, roln_real *zd) \
    { \
        roln_real c[count], v[count]; \
        int i; \
        CHECK_OK(NAME##_friction_of(p, c, v)); \
        for (i = 0; i < (count); i++) \
            zd[i] += 4 * v[i]; \
    }

#define OBSERVED(x) cart_##x
#define OBSERVED_SLIDE(p, zd) (void)(zd)
#define OBSERVED_LEAPS 1
#define OBSERVED_LAST(o) (o).zdd
#include "observed.h"
#undef OBSERVED
#define OBSERVED(x) sheet_##x
#include "observed.h"
#undef OBSERVED
#undef OBSERVED_SLIDE

SLIDE(rough, 3)
#define OBSERVED(x) rough_##x
#define OBSERVED_SLIDE(p, zd) slide_rough(p, zd)
#include "observed.h"
#undef OBSERVED
#undef OBSERVED_SLIDE
#undef OBSERVED_LEAPS
#undef OBSERVED_LAST

SLIDE(held, 2)
static roln_real still[2]; /* it has no last step of leapfrog */
#define OBSERVED(x) held_##x
#define OBSERVED_SLIDE(p, zd) slide_held(p, zd)
#define OBSERVED_LEAPS 0
#define OBSERVED_LAST(o) still
#include "observed.h"

void TEST_NAME(observer)(void)
{
    cart_test_observer();
    sheet_test_observer();
    rough_test_observer();
    held_test_observer();
    print_bounds();
}
