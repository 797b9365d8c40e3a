#!/bin/sh
# Each header alone, as float and as double, under every compiler and warning in use: no output. roln.h also with models.
# int32_t is long to arm-none-eabi-gcc, and int to the others.
cd "$(dirname "$0")/../.." || exit 1
warn='-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Werror'
strict='-Wstrict-prototypes -Wmissing-prototypes'
passed=0
failed=0
for header in roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h tests/compilers/models.h; do
    for type in '' -DROLN_DOUBLE -DROLN_SIMD=0; do
        for cc in "gcc -std=c99 -xc $strict" "clang -std=c99 -xc $strict" 'g++ -std=c++11 -xc++' 'clang++ -std=c++11 -xc++' \
            "arm-none-eabi-gcc -mcpu=cortex-m4 -mfloat-abi=hard -std=c99 -xc $strict" \
            "riscv64-unknown-elf-gcc -march=rv32imfc -mabi=ilp32f --specs=picolibc.specs -std=c99 -xc $strict"; do
            for level in -O0 -O2; do
                if echo "#include \"$header\"" | $cc $type $warn $level -I. -c -o /dev/null - ; then
                    passed=$((passed + 1))
                else
                    failed=$((failed + 1))
                    echo "$cc $type $level $header"
                fi
            done
        done
    done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
