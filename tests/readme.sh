#!/bin/sh
# Every C block of README.md compiles without a warning, links and runs; every example compiles with the line it gives.
cd "$(dirname "$0")/.." || exit 1
mkdir -p build/readme
rm -f build/readme/*
passed=0
failed=0
check() {
    if sh -c "$1" > build/readme/log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$1"
        cat build/readme/log
    fi
}
awk '/^```c$/ { n++; on = 1; next } /^```$/ { on = 0 } on { print > ("build/readme/block" n ".c") }' README.md
for f in build/readme/block*.c; do
    check "gcc -std=c99 -O1 -Wall -Wextra -Wconversion -Wdouble-promotion -Werror -I. -Iexamples $f -o build/readme/block -lm && build/readme/block"
done
warn='-D_POSIX_C_SOURCE=200809L -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wcast-qual -Wvla -Werror'
for cc in gcc clang; do
    for f in pendulum spd control_tick 'train -DMODEL=pend16 -lpthread' 'train -DMODEL=pend2 -lpthread'; do
        set -- $f
        check "$cc -std=c99 -O1 $warn -I. -Iexamples $2 examples/$1.c -o build/readme/$1 $3 -lm"
    done
done
for f in spd control_tick; do
    check "build/readme/$f"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
