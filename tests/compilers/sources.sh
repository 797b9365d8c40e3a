#!/bin/sh
# SPDX-License-Identifier: MIT
# Every program in C of examples and tests passes the compiler, so that a change of the headers shows here and not hours later.
# Not those of tests/unit and tests/user/limits.c, which other steps of make test compile, nor those of tests/safety/proof, which
# see the headers without the functions that a proof replaces.
cd "$(dirname "$0")/../.." || exit 1
arm=' -DCONFIG="arm.h" -DWEIGHTS="arm_weights.h" -DLIMITS="arm_limits.h"'
mkdir -p build
passed=0
failed=0
make --no-print-directory build/firmware/pend16_weights.h > build/sources.log 2>&1 || cat build/sources.log
for file in $(find examples tests -name '*.c' ! -path 'tests/unit/*' ! -path tests/user/limits.c \
    ! -path 'tests/safety/proof/*' | sort); do
    cc='gcc -D_POSIX_C_SOURCE=200809L' model=pend2
    case $file in
    examples/quantise.c) model=pend16_int8 ;;
    tests/experiments/config.c) cc="$cc -DCONFIG=pend2" ;;
    tests/experiments/doubt.c | tests/experiments/layers.c) cc="$cc$arm" model=arm ;;
    tests/firmware/bits.c) cc='arm-none-eabi-gcc -mcpu=cortex-m55 -mfloat-abi=hard' ;;
    tests/firmware/fault.c) cc="$cc -DFAULT=1" ;;
    tests/measure/firmware.c) cc="$cc -DSTATES=9" model=arm ;;
    tests/measure/longest.c | tests/measure/measure.c) cc="$cc -DWORST -DSTATES=9" ;;
    tests/measure/plan.c) cc="$cc -DWIDE=8 -DPLANS=9" ;;
    tests/safety/steady.c) cc="$cc -DWORST" ;;
    esac
    if out=$($cc -std=c99 -w -fsyntax-only -DMODEL=$model -I. -Iexamples -Iexamples/firmware -Ibuild/firmware -Itests -Itests/unit \
        -Itests/measure -Itests/control $(pkg-config --cflags hdf5) "$file" 2>&1); then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$file"
        echo "$out" | head -n 5
    fi
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
