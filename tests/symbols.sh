#!/bin/sh
# An object with every function kept takes nothing from outside but sqrt and mem*, and has no writable data (as in firmware,
# code at fixed addresses: the tables of verbs hold addresses of functions).
cd "$(dirname "$0")/.." || exit 1
mkdir -p build
passed=0
failed=0
for type in '' -DROLN_DOUBLE; do
    for cc in gcc clang; do
        rm -f build/symbols.o
        if ! $cc -std=c99 -xc -DROLN_FN= $type -O2 -fno-pie -fno-math-errno -c -o build/symbols.o tests/models.h; then
            failed=$((failed + 1))
            echo "$cc $type: does not compile"
            continue
        fi
        outside=$(nm -u build/symbols.o | awk '{print $2}' | grep -vxE 'sqrtf?|memcpy|memset|memcmp|memmove|__stack_chk_fail')
        data=$(nm build/symbols.o | awk '$2 ~ /^[DdBbCGgSs]$/ {print $3}')
        for found in "$outside" "$data"; do
            if [ -z "$found" ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$cc $type: $found"; fi
        done
        functions=$(nm build/symbols.o | grep -c ' T ')
        if [ "$functions" -ge 100 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "only $functions functions"; fi
    done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
