/* SPDX-License-Identifier: MIT */
#include "check.h"

long check_passed, check_failed;
int check_sample;

static int report(int ok)
{
    if (ok) check_passed++;
    else check_failed++;
    return ok;
}

int check_that(int ok, const char *what, const char *file, int line)
{
    if (!ok) printf("%s:%d: %s\n", file, line, what);
    return report(ok);
}

int check_near(double a, double b, double tol, const char *what, const char *file, int line)
{
    int ok = a - b <= tol && b - a <= tol;
    if (!ok) printf("%s:%d: %s: %.9g, %.9g differ by more than %.3g\n", file, line, what, a, b, tol);
    return report(ok);
}

int check_below(double a, double bound, const char *what, const char *file, int line)
{
    int ok = a <= bound;
    if (!ok) printf("%s:%d: %s: %.9g > %.9g\n", file, line, what, a, bound);
    return report(ok);
}
