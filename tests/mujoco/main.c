/* SPDX-License-Identifier: MIT */
/* main.c - the tests that need MuJoCo and HDF5. */
#include "../unit/check.h"

void test_truth(void);
void test_models(void);
void test_control(void);
void test_friction(void);
void test_furuta(void);
void test_arm(void);
void test_load(void);

int main(void)
{
    test_truth();
    test_models();
    test_control();
    test_friction();
    test_furuta();
    test_arm();
    test_load();
    printf("%ld passed, %ld failed\n", check_passed, check_failed);
    return check_failed != 0;
}
