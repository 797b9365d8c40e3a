/* SPDX-License-Identifier: MIT */
/* The observer with steady gains: gains against a covariance that settles in long double, a tick against its definition, faults,
   and errors beside those of the filter. */
#include "check.h"

/* An angle and a slider. */
#define ROLN_NAME cart
#define ROLN_AE 2
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

#define CALLED(X) X(decode)
#include "small.h"

void TEST_NAME(observer)(void);

#define CHECK_OK(call) CHECK((call) == ROLN_OK)

#define OBSERVED(x) cart_##x
#define OBSERVED_SLIDE(p, zd) (void)(zd)
#include "observed.h"
#undef OBSERVED
#define OBSERVED(x) sheet_##x
#include "observed.h"
#undef OBSERVED
#undef OBSERVED_SLIDE

static void slide_rough(const rough_params *p, roln_real *zd)
{
    roln_real c[3], v[3];
    int i;
    CHECK_OK(rough_friction_of(p, c, v));
    for (i = 0; i < 3; i++)
        zd[i] += 4 * v[i];
}
#define OBSERVED(x) rough_##x
#define OBSERVED_SLIDE(p, zd) slide_rough(p, zd)
#include "observed.h"

void TEST_NAME(observer)(void)
{
    cart_test_observer();
    sheet_test_observer();
    rough_test_observer();
    print_bounds();
}
