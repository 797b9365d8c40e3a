/* SPDX-License-Identifier: MIT */
/* check.h - the smallest test frame that serves: counts checks, prints the failing ones, goes on.
   Every test file is compiled twice, as float and with -DROLN_DOUBLE, and linked into one binary. */
#ifndef CHECK_H
#define CHECK_H

#include <stdio.h>
#include <stdint.h>

extern long check_passed, check_failed;
extern int check_sample; /* sweeps over millions of numbers take a sample: make check, sanitizers, coverage */

#define CHECK(cond) check_that((cond) != 0, #cond, __FILE__, __LINE__)

/* |a - b| <= tol, both sides printed when it fails; NaN fails. */
#define CHECK_NEAR(a, b, tol) check_near((double)(a), (double)(b), (double)(tol), #a " ~ " #b, __FILE__, __LINE__)

/* a <= bound, printed when it fails; NaN fails. */
#define CHECK_BELOW(a, bound) check_below((double)(a), (double)(bound), #a " <= " #bound, __FILE__, __LINE__)

int check_that(int ok, const char *what, const char *file, int line);
int check_near(double a, double b, double tol, const char *what, const char *file, int line);
int check_below(double a, double bound, const char *what, const char *file, int line);

/* TEST_NAME(spd) is test_spd_f32 or test_spd_f64: the one function that a test file exports. */
#ifdef ROLN_DOUBLE
#define TEST_NAME(x) test_##x##_f64
#define TEST_PRECISION "double"
#else
#define TEST_NAME(x) test_##x##_f32
#define TEST_PRECISION "float"
#endif

#endif
