#!/bin/sh
# SPDX-License-Identifier: MIT
# Each header alone, as float and as double, under every compiler and warning in use: no output. roln.h also with models.
# int32_t is long to arm-none-eabi-gcc, and int to the others. At -O2, where compilers warn of all that they warn of at -O0. Then
# compilers of fewer warnings or features: C++17 that takes no cast of C, tcc, and one that claims to be GNU C but does not know all
# of it, as pcc and others do. Then every standard from C99 and C++11 to the newest that a compiler knows: what users do with
# constants, the examples, and what firmware in C++ takes of them. Then compilers that are not GNU C, or do not say that they are:
# clang for Windows, others.
#   warnings.sh test    gcc, clang, g++ and arm-none-eabi-gcc on each header as float: a part of make test
cd "$(dirname "$0")/../.." || exit 1
warn='-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Werror'
strict='-Wstrict-prototypes -Wmissing-prototypes'
mkdir -p build/stub # not /dev/null: a compiler that fails removes what it wrote to
passed=0
failed=0
headers='roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h tests/compilers/models.h'
first() {
    echo "gcc -std=c99 -xc $strict"
    echo "clang -std=c99 -xc $strict"
    echo 'g++ -std=c++11 -xc++'
    echo "arm-none-eabi-gcc -mcpu=cortex-m4 -mfloat-abi=hard -std=c99 -xc $strict"
    [ "$1" != test ] || return
    echo 'clang++ -std=c++11 -xc++'
    echo "arm-none-eabi-gcc -mcpu=cortex-m55 -mfloat-abi=hard -std=c99 -xc $strict"
    echo 'arm-none-eabi-g++ -mcpu=cortex-m55 -mfloat-abi=hard -std=c++11 -xc++'
    echo "riscv64-unknown-elf-gcc -march=rv32imfc -mabi=ilp32f --specs=picolibc.specs -std=c99 -xc $strict"
}
types='-O2 -DROLN_DOUBLE -DROLN_SIMD=0'
[ "$1" != test ] || types=-O2
for header in $headers; do
    for type in $types; do
        IFS='
'
        for cc in $(first "$1"); do
            unset IFS
            if echo "#include \"$header\"" | $cc $type $warn -O2 -I. -c -o build/warnings.o - ; then
                passed=$((passed + 1))
            else
                failed=$((failed + 1))
                echo "$cc $type $header"
            fi
        done
    done
done
end() {
    echo "$passed passed, $failed failed"
    [ "$failed" -eq 0 ]
    exit
}
[ "$1" != test ] || end
# try COMMAND ..: of the text $text it makes an object, or looks at it, and says nothing
try() {
    if out=$(echo "$text" | "$@" $type -I. -Iexamples - 2>&1) && [ -z "$out" ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$* $type $text"
        echo "$out" | head -n 5
    fi
}
object='-c -o build/warnings.o'
for header in $headers; do
    text="#include \"$header\""
    for type in '' -DROLN_DOUBLE; do
        try g++ $object -std=c++17 -xc++ -Wall -Wextra -Wpedantic -Wold-style-cast -Wno-unused-function
        try tcc $object -std=c99 -Wall
        try gcc $object -std=c99 -xc -Wall -Wno-unused-function -U__ATOMIC_ACQ_REL -DROLN_SIMD=0
    done
done

# every standard; clang 19 also warns in C of a real beside an enumerator, which a size is there
c='c99 c11 c17 c2x gnu99 gnu11 gnu17 gnu2x'
cxx='c++11 c++14 c++17 c++20 c++23'
quiet=-Wno-enum-float-conversion
type=
text='#include "tests/compilers/constants.h"'
for std in $c; do
    try gcc -std=$std -xc $warn $strict -fsyntax-only
    try clang-19 -std=$std -xc $warn $quiet -fsyntax-only
done
for std in $cxx gnu++11 gnu++20 gnu++23; do try g++ -std=$std -xc++ $warn -Wdeprecated -fsyntax-only; done
for std in $cxx c++26 gnu++26; do
    try clang++-19 -std=$std -xc++ $warn -Wdeprecated -fsyntax-only
    type=-DROLN_DOUBLE
    try clang++-19 -std=$std -xc++ $warn -Wdeprecated -fsyntax-only
    type=
done
for file in examples/*.c; do
    text="#include \"$file\""
    type="-D_POSIX_C_SOURCE=200809L -DMODEL=$([ "$file" = examples/quantise.c ] && echo pend16_int8 || echo pend2)"
    for std in c11 c2x gnu17; do try clang-19 -std=$std -xc $warn $quiet -fsyntax-only; done
    for std in c17 c2x gnu99; do try gcc -std=$std -xc $warn -fsyntax-only; done
done
type=
for file in arm_tick.h furuta_tick.h chain_weights.h firmware/frame.h; do
    [ "$file" = "${file%_weights.h}" ] && first= || first="#include \"${file%_weights.h}.h\""
    text="#include <math.h>
$first
#include \"examples/$file\""
    try g++ -std=c++20 -xc++ -Wall -Wpedantic -Wno-unused-function -Wno-unused-variable -fsyntax-only
    for std in c++20 c++23 c++26; do
        try clang++-19 -std=$std -xc++ -Wall -Wpedantic -Wno-unused-function -Wno-unused-variable -fsyntax-only
    done
done

# clang for Windows does not define __GNUC__; without __clang__, too, it is a compiler of which roln knows nothing. Headers of
# Windows are not there: these declare what roln takes from outside.
cat > build/stub/math.h << 'END'
#ifdef __cplusplus
extern "C" {
#endif
double sqrt(double), fabs(double);
float sqrtf(float), fabsf(float);
void *memcpy(void *, const void *, __SIZE_TYPE__), *memmove(void *, const void *, __SIZE_TYPE__);
void *memset(void *, int, __SIZE_TYPE__);
#ifdef __cplusplus
}
#endif
#define NAN __builtin_nanf("")
END
echo '#include <math.h>' > build/stub/string.h
for header in roln_spd.h tests/compilers/models.h; do
    text="#include \"$header\""
    for target in x86_64-pc-windows-msvc i686-pc-windows-msvc aarch64-pc-windows-msvc x86_64-w64-windows-gnu; do
        for lang in '-xc -std=c99' '-xc++ -std=c++20'; do
            for type in '' '-fgnuc-version=0 -U__clang__'; do
                try clang-19 --target=$target -ffreestanding -Ibuild/stub $lang -Wall -Wextra -Wundef -fsyntax-only
            done
        done
    done
done
end
