#!/bin/sh
# SPDX-License-Identifier: MIT
# analyzers.sh - what static analysers say of the headers, by models that have every option (options.h), and of the examples:
# nothing but what stands below, each with the reason why it is no defect. Last line: N passed, N failed.
#
# clang-tidy's groups bugprone and cert, clang's own analyser, which follows every path through every function of the headers,
# gcc's analyser, which ends in useful time on roln_spd.h alone, and cppcheck. C as firmware compiles it, ROLN_SIMD 0.
cd "$(dirname "$0")/../.." || exit 1
dir=build/analyzers
rm -rf $dir
mkdir -p $dir
c='-std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -DROLN_SIMD=0 -I. -Iexamples -Iexamples/firmware'
model=pend2
passed=0
failed=0

# checks that are off
off() { sed 's/:.*//' << 'end' | tr '\n' ','
-bugprone-easily-swappable-parameters: arguments come in one order, object, sizes, inputs, outputs; kernels take several sizes
-bugprone-implicit-widening-of-multiplication-result: indices are products of sizes, ints whose products are the sizes of arrays
-bugprone-narrowing-conversions: ints become reals where they are small and so exact; -Wconversion is an error in every build
-bugprone-macro-parentheses: lists of scratch and local macros take names and statements; docs/misra.md, rule 20.7
-bugprone-not-null-terminated-result: marks of formats are four bytes, not strings
-bugprone-reserved-identifier: _POSIX_C_SOURCE is what POSIX wants to be defined
-bugprone-suspicious-memory-comparison: the checkpoints of train.c are of zeroed memory, padding and all
-bugprone-integer-division: halves of numbers of steps, rounded down on purpose
-cert-dcl37-c: bugprone-reserved-identifier by another name, as the next one
-cert-dcl51-cpp:
-cert-exp42-c: bugprone-suspicious-memory-comparison by another name, as the next one
-cert-flp37-c:
-cert-flp30-c: powers of two, which are exact, and ticks of a picture; docs/misra.md, rule 14.1
-cert-err33-c: results of printf to a screen; files that matter are looked at when they are closed
end
}

# what is no defect: tool, check, file, count, reason
known() { cat << 'end'
clang core.CallAndMessage roln_lnn.h 2 directions of a row: as many are there as k says
clang core.NullDereference roln.h 6 want is NULL: then NAME_i_faults sets ROLN_FAULT_STATUS and bad is not 0; arrays of scratch, and
    one that a function before has refused to be NULL
clang core.NonNullParamChecker roln_spd.h 2 arrays of scratch
clang deadcode.DeadStores roln.h 10 what a model without inputs, without an autoencoder or without a load does not read
cppcheck nullPointer roln.h 5 NULL where it is not read: of a model without a load, and behind `each ?`
cppcheck nullPointer roln_spd.h 2 a copy of no numbers to or from NULL, behind `if (number > 0)`
cppcheck ctunullpointer roln_spd.h 3 the same
cppcheck zerodiv roln.h 3 ROLNI_TRUE, a check at compile time, which cppcheck computes wrongly
cppcheck legacyUninitvar roln_riem.h 1 ROLNI_LD2 assigns both of u, here and in the next
cppcheck legacyUninitvar roln_spd.h 1
cppcheck nullPointerRedundantCheck smoother.h 2 fail ends the program
cppcheck uninitvar arm.c 1 a struct or array that loops fill, here and in the next seven
cppcheck uninitvar arm_plant.h 1
cppcheck uninitvar belt_plant.h 2
cppcheck uninitvar chain_plant.h 1
cppcheck uninitvar pendulum.c 1
cppcheck uninitvar recording.h 1
cppcheck uninitvar report.h 1
cppcheck uninitvar smoother.h 2
cppcheck arrayIndexThenCheck report.h 1 an index that is compared with another, not with a limit
cppcheck comparePointers start_arm.c 2 ends of sections, from the linker
end
}

# look TOOL: $dir/TOOL.said has `FILE:LINE:COLUMN: KIND: text [CHECK]` for each finding; the same in two of the sources is one
look() {
    sed -n 's,^\(.*/\)*\([^/:]*\):\([0-9]*\):\([0-9]*\): [a-z ]*: .*\[-*\([^][]*\)\]$,\2:\3:\4 \5,p' "$dir/$1.said" | sort -u |
        awk '{ sub(/:.*/, "", $1); print $2, $1 }' | sort | uniq -c | awk '{ print $2, $3, $1 }' | sort > "$dir/$1.found"
    known | awk -v tool="$1" '$1 == tool { print $2, $3, $4 }' | sort | diff - "$dir/$1.found" > "$dir/$1.diff"
    check "$1: < known, > found" "$dir/$1.diff"
}
# check TEXT FILE: nothing is in FILE
check() {
    if [ -s "$2" ]; then
        failed=$((failed + 1))
        echo "$1"
        head -n 40 "$2"
    else
        passed=$((passed + 1))
    fi
}
# ran TOOL: it has found no error in what it was to read
ran() {
    grep -E 'error: .*[^]]$|clang-diagnostic-error|unknownMacro|syntaxError|internal[A-Za-z]*Error|preprocessorErrorDirective' \
        "$dir/$1.said" > "$dir/$1.wrong"
    check "$1 could not read" "$dir/$1.wrong"
}

# what needs weights or another target is left out
examples=$(ls examples/*.c examples/firmware/*.c | grep -vE '/(serial|start_riscv|emulator)[.]c$')
echo '#include "tests/safety/options.h"' > $dir/options.c
# defects, which each tool must see
cat > $dir/defect.h << 'end'
static int defect(const int *p, int n)
{
    if (!p) n += *p;
    int m;
    if (n > 3) m = n;
    else m = n;
    return m;
}
end
printf '#include "defect.h"\nint use(int n);\nint use(int n)\n{\n    return defect(0, n);\n}\n' > $dir/defect.c
# tools: SOURCE .., what they say
tidy() {
    clang-tidy --quiet --header-filter='.*' -checks="-*,bugprone-*,cert-*,$(off)" "$@" -- $c -DMODEL=$model 2>&1
}
clang_analyse() {
    clang $c --analyze -Xclang -analyzer-opt-analyze-headers --analyzer-output text "$@" 2>&1 | grep -v ' note: '
}
gcc_analyse() { # external functions, for unused static ones are gone before it looks
    gcc $c -DROLN_FN= -xc -O1 -fanalyzer -c -o $dir/gcc.o "$@" 2>&1
}
cpp() {
    cppcheck -q --std=c99 --language=c --enable=warning,portability -DROLN_SIMD=0 -DROLN_STANDARD '-DUINT32_C(x)=x##U' \
        '-DUINT64_C(x)=x##ULL' --template='{file}:{line}:{column}: {severity}: {message} [{id}]' "$@" 2>&1
}
for tool in tidy clang_analyse gcc_analyse cpp; do
    $tool $dir/defect.c > $dir/defect.said
    grep -q 'defect.h:[0-9]*:[0-9]*: warning' $dir/defect.said || echo "$tool" >> $dir/blind
done
check 'see nothing in defect.h' $dir/blind

tidy $dir/options.c $(echo "$examples" | grep -v /quantise.c) > $dir/clang-tidy.said
model=pend16_int8
tidy examples/quantise.c >> $dir/clang-tidy.said
clang_analyse $dir/options.c > $dir/clang.said
gcc_analyse roln_spd.h > $dir/gcc.said
{ cpp -I. $dir/options.c; cpp -DROLN_H -Iexamples -Iexamples/firmware $examples; } > $dir/cppcheck.said
for tool in clang-tidy clang gcc cppcheck; do
    ran $tool
    look $tool
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
