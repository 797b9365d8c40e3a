#!/bin/sh
# SPDX-License-Identifier: MIT
# Each header alone, as float and as double, under every compiler and warning in use: no output. roln.h also with models.
# int32_t is long to arm-none-eabi-gcc, and int to the others. At -O2, where compilers warn of all that they warn of at -O0. Then
# compilers of fewer warnings or features: C++17 that takes no cast of C, tcc, and one that claims to be GNU C but does not know all
# of it, as pcc and others do.
cd "$(dirname "$0")/../.." || exit 1
warn='-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Werror'
strict='-Wstrict-prototypes -Wmissing-prototypes'
mkdir -p build # not /dev/null: a compiler that fails removes what it wrote to
passed=0
failed=0
for header in roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h tests/compilers/models.h; do
    for type in '' -DROLN_DOUBLE -DROLN_SIMD=0; do
        for cc in "gcc -std=c99 -xc $strict" "clang -std=c99 -xc $strict" 'g++ -std=c++11 -xc++' 'clang++ -std=c++11 -xc++' \
            "arm-none-eabi-gcc -mcpu=cortex-m4 -mfloat-abi=hard -std=c99 -xc $strict" \
            "riscv64-unknown-elf-gcc -march=rv32imfc -mabi=ilp32f --specs=picolibc.specs -std=c99 -xc $strict"; do
            if echo "#include \"$header\"" | $cc $type $warn -O2 -I. -c -o build/warnings.o - ; then
                passed=$((passed + 1))
            else
                failed=$((failed + 1))
                echo "$cc $type $header"
            fi
        done
    done
done
try() {
    if out=$(echo "#include \"$header\"" | "$@" $type -I. -c -o build/warnings.o - 2>&1) && [ -z "$out" ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$* $type $header"
        echo "$out" | head -n 5
    fi
}
mkdir -p build
for header in roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h tests/compilers/models.h; do
    for type in '' -DROLN_DOUBLE; do
        try g++ -std=c++17 -xc++ -Wall -Wextra -Wpedantic -Wold-style-cast -Wno-unused-function
        try tcc -std=c99 -Wall
        try gcc -std=c99 -xc -Wall -Wno-unused-function -U__ATOMIC_ACQ_REL -DROLN_SIMD=0
    done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
