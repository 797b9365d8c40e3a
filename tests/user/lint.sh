#!/bin/sh
# SPDX-License-Identifier: MIT
# examples/lint.sh: silent about configs that are right, among them all that the examples and tests compile, and about every option
# in the table of roln.h; each wrong one with its line and its words. Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
dir=build/lint
rm -rf $dir
mkdir -p $dir
passed=0
failed=0
# says CODE WORDS CONFIG LINE ..: of this config (printf's escapes) lint ends with CODE and says WORDS alone; - is silence
says() {
    code=$1
    words=$2
    shift 2
    printf '%s\n' "$@" > $dir/arm.h
    out=$(sh examples/lint.sh $dir/arm.h 2>&1)
    if [ $? -eq "$code" ] && if [ "$words" = - ]; then [ -z "$out" ]; else [ "$out" = "$dir/arm.h:$words" ]; fi; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "wanted $words of"
        printf '  %s\n' "$@"
        echo "$out"
    fi
}
name='#define ROLN_NAME arm'
ae='#define ROLN_AE 4, 2'
mlp='#define ROLN_MLP 8'
end='#include "roln.h"'

says 0 - "$name" "$ae" "$mlp" "$end"
says 0 - '#ifndef ARM_H' '#define ARM_H' "$name /* the arm" 'ROLN_NO #define ROLN_NO */' \
    "  # define ROLN_AE 4, 2 // #define ROLN_AE" "$mlp" '#include <roln/roln.h>' '#endif'
says 0 - "$name" "$ae" "$mlp" "$end" '#define ROLN_NAME leg' "$ae" "$mlp" "$end"
says 0 - '#define ROLN_CODE __attribute__((section(".itcm")))' "$name" "$ae" "$mlp" "$end"
says 0 - '#define ROLN_WEIGHTS_EXTERN' "$name" "$ae" "$mlp" "$end"
says 1 '1: ROLN_WEIGHT_EXTERN: no header of roln reads it. ROLN_WEIGHTS_EXTERN?' '#define ROLN_WEIGHT_EXTERN' \
    "$name" "$ae" "$mlp" "$end"
says 1 '4: ROLN_DAMPNG: no header of roln reads it. ROLN_DAMPING?' "$name" "$ae" "$mlp" '#define ROLN_DAMPNG 1' "$end"
says 1 '4: ROLN_DAPMING: no header of roln reads it. ROLN_DAMPING?' "$name" "$ae" "$mlp" '#define ROLN_DAPMING 1' "$end"
says 1 '4: RLON_INTEGRATOR: no header of roln reads it. ROLN_INTEGRATOR?' "$name" "$ae" "$mlp" '#define RLON_INTEGRATOR rk4' "$end"
says 1 '4: ROLN_INTEGRATE: no header of roln reads it. ROLN_INTEGRATOR?' "$name" "$ae" "$mlp" '#define ROLN_INTEGRATE rk4' "$end"
says 1 '4: ROLN_TRANSMISSION: no header of roln reads it' "$name" "$ae" "$mlp" '#define ROLN_TRANSMISSION 7' "$end"
says 1 '4: ROLN_MLP: for the second time, the first is in line 3' "$name" "$ae" "$mlp" '#define ROLN_MLP 9' "$end"
says 1 '5: ROLN_INTEGRATOR: behind the last #include "roln.h", where no model reads it' "$name" "$ae" "$mlp" "$end" \
    '#define ROLN_INTEGRATOR rk4'
says 1 '3: a model without ROLN_AE' "$name" "$mlp" "$end"
says 1 '3: a model without ROLN_MLP or ROLN_POLYNOMIALS' "$name" "$ae" "$end"
says 0 - "$name" "$ae" '#define ROLN_POLYNOMIALS 4, 7' "$end"
says 1 '1: ROLN_AE: there is no ROLN_NAME, so no model reads it' "$ae" "$end"
says 1 '1: no #include "roln.h", so no model' '#define ARM 1'

# every option of the table is one, misspelt it is none; and every option that the shell reads is in the table
table=$(sed -n '/^#ifndef ROLN_H/q; s/^ *#define \(ROLN_[A-Z_]*\) .*/\1/p' roln.h)
shell=$(awk '/^#ifdef ROLN_NAME/ { on = 1; print $2 } on && /^#ifndef ROLN_/ { print $2 }' roln.h)
if [ "$(echo "$table" | sort)" = "$(echo "$shell" | sort)" ] && [ "$(echo "$table" | wc -l)" -ge 18 ]; then
    passed=$((passed + 1))
else
    failed=$((failed + 1))
    echo "table at the top of roln.h:" $table ", but the shell reads" $shell
fi
for o in $table; do
    case $o in ROLN_NAME | ROLN_AE | ROLN_MLP) continue ;; esac
    says 0 - "$name" "$ae" "$mlp" "#define $o 1" "$end"
    says 1 "4: ${o}Q: no header of roln reads it. $o?" "$name" "$ae" "$mlp" "#define ${o}Q 1" "$end"
done
for f in examples/chain.h examples/pend2.h examples/pend16.h examples/pend16_layers.h examples/pend16_int8.h tests/unit/small.h \
    tests/compilers/models.h tests/compilers/hash.c; do
    if make -s lint CONFIG=$f; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
done
# what cannot be read, and nothing at all
if sh examples/lint.sh $dir/none.h | grep -q 'none.h: cannot be read'; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
if sh examples/lint.sh | grep -q 'make lint CONFIG=examples/arm.h'; then passed=$((passed + 1)); else failed=$((failed + 1)); fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
