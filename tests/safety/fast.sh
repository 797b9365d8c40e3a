#!/bin/sh
# SPDX-License-Identifier: MIT
# fast.sh - the finite checks under -ffast-math (fast.c), of three compilers for this machine. Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
passed=0
failed=0
# clang 19 warns of what it chooses itself for CPUs with AVX10
quiet='-Wno-unknown-warning-option -Wno-invalid-feature-combination'
for cc in gcc clang clang-19; do
    : > build/fast.log
    for options in '-O2' '-O3 -march=native' '-Os -DROLN_SIMD=0'; do
        good=0 bad=1
        $cc -std=c99 -ffast-math $options -Wall -Wextra -Werror $quiet -I. -Iexamples tests/safety/fast.c -o build/fast -lm &&
            build/fast > build/fast.log
        eval "$(sed -n 's/^\([0-9]*\) passed, \([0-9]*\) failed$/good=\1 bad=\2/p' build/fast.log)"
        [ "$bad" -eq 0 ] || { echo "$cc $options"; cat build/fast.log; }
        passed=$((passed + good)) failed=$((failed + bad))
        : > build/fast.log
    done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
