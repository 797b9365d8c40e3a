#!/bin/sh
# SPDX-License-Identifier: MIT
# numerics.sh - errors of arithmetic: of every function of one float, of Cholesky and the SPD maps, and of what a torque's error is
# made of, beside the tables of docs/accuracy.md, between `<!-- numerics -->` and `<!-- end of numerics -->`.
#
#   numerics.sh         all 2^32 floats and a million matrices as float and as double: five to thirty minutes of a core
#   numerics.sh -w      ... into that text; EVERY=16: of the floats every 16th block, and it says so
#   numerics.sh test    every 512th block of 1024 floats, 20,000 matrices; the torques, all of them, are those of the text
#
# Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
out=build/numerics
text=docs/accuracy.md
every=${EVERY:-1} matrices=1000000
if [ "$1" = test ]; then every=512 matrices=20000; fi
mkdir -p $out
std='-std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -Wall -Wextra -Wpedantic -Werror -I. -Iexamples -Itests/unit'
fast='-O3 -march=native -fno-math-errno'
passed=0
failed=0
check() { # text command ..: the passed and failed of its last line, or its exit code; the rest to $out/TEXT
    name=$1
    shift
    "$@" > "$out/$name" 2> "$out/$name.log"
    code=$?
    last=$(sed -n '$s/^\([0-9]*\) passed, \([0-9]*\) failed$/\1 \2/p' "$out/$name")
    set -- ${last:-1 0}
    [ $code -eq 0 ] || [ "$2" -ne 0 ] || set -- 0 1
    passed=$((passed + $1)) failed=$((failed + $2))
    [ "$2" -eq 0 ] || { echo "failed: $name"; grep failed "$out/$name"; head -n 5 "$out/$name.log"; }
}
floats() {
    gcc -std=c99 $fast -ffast-math -I. -c tests/safety/floats_reference.c -o $out/reference.o &&
        gcc $std $fast -fno-trapping-math tests/safety/floats.c $out/reference.o -o $out/run_floats -lm &&
        $out/run_floats $every
}
spd() {
    gcc $std $fast $1 tests/safety/spd_million.c tests/unit/check.c -o $out/run_spd$1 -lm && $out/run_spd$1 $matrices
}

# one model: its torques in float, in double, stored, of its plant
torques() {
    for way in "float -DHERE=$1_weights.h -DPLANT=$1_plant.h" 'double -DROLN_DOUBLE' 'half -DSTORED -DROLN_QUANTISE=half' \
               'int8 -DSTORED -DROLN_QUANTISE=int8'; do
        set -- "$1" "$2" "$3" $way
        options="$5 $6" file=
        [ "$4" = float ] && [ "$2" = - ] && options=$5
        [ "$4" = float ] && [ "$3" != - ] && options= file=$3
        case $4$2 in half- | int8-) [ "$1" = chain ] || [ "$1" = pend16 ] || continue ;; half* | int8*) continue ;; esac
        mkdir -p $out/"$1"
        gcc $std -O2 -Wno-unused-function -DMODEL="$1" $options tests/safety/split.c -o $out/"$1"/"$4" -lm &&
            $out/"$1"/"$4" "$4" $out/"$1" $file > $out/"$1"/"$4".txt || return 1
    done
}
# rms difference of two files over the rms of the second, in percent
off() {
    [ -f "$1" ] && [ -f "$2" ] || { echo '-'; return; }
    paste -d ' ' "$1" "$2" | awk '{ for (i = 1; i <= NF / 2; i++) { d = $i - $(i + NF / 2); e += d * d; s += $(i + NF / 2) ^ 2 } }
        END { printf "%.2g %%\n", 100 * sqrt(e / s) }'
}
split() {
    rm -rf $out/chain $out/furuta $out/arm $out/pend16
    torques chain - - && torques furuta plant - && torques arm plant - && torques pend16 - tests/mujoco/models/pend16_act.roln ||
        return 1
    for m in chain furuta arm pend16; do
        o=$out/$m
        echo "| $m | $(off $o/double.txt $o/plant) | $(off $o/float.txt $o/double.txt) | $(off $o/half.txt $o/float.txt) |" \
             "$(off $o/int8.txt $o/float.txt) |"
    done
}

check floats floats
check 'spd, float' spd
check 'spd, double' spd -DROLN_DOUBLE
check torques split
{
    echo 'Of a function of one float, over'
    [ "$every" -eq 1 ] && echo 'all 2^32 of them:' || echo "every ${every}th block of 1,024 of them:"
    printf '\n| function | unit | worst error | at | bound |\n|---|---|---|---|---|\n'
    grep '^|' $out/floats | sed 's|  *| |g'
    printf '\nOf %s symmetric matrices of 1 to 8 rows each, float and double, in the units of their bounds:\n' $matrices
    printf '\n| function | type | matrices | refused | worst | bound |\n|---|---|---|---|---|---|\n'
    grep -h '^|' "$out/spd, float" "$out/spd, double" | sed 's|  *| |g'
    printf '\nOf the torques of 1,000 control ticks, rms over rms:\n'
    printf '\n| model | the model, against its plant | float, against double | half, against full | int8, against full |\n'
    echo '|---|---|---|---|---|'
    cat $out/torques
    printf '\nLast run %s.\n' "$(date -u +%Y-%m-%d)"
} > $out/table
[ "$1" = test ] || cat $out/table
if [ "$1" = -w ] && [ $failed -eq 0 ]; then
    awk -v table=$out/table '/^<!-- end of numerics -->$/ { on = 0 } !on
         /^<!-- numerics -->$/ { on = 1; while ((getline line < table) > 0) print line }' $text > $out/text && cp $out/text $text
fi
check 'torques are those of the text' awk 'NR == FNR { want[$0] = 1; next } !($0 in want) { print "failed", $0; bad = 1 }
    END { exit bad }' $text $out/torques
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
