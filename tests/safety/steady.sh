#!/bin/sh
# SPDX-License-Identifier: MIT
# steady.sh - what the time of a control tick, a step and a tick of the filter depends on, of two models that sizes.sh measures:
# the functions in which the branches taken differ from state to state are those of the list below, whose longest way
# tests/measure/longest_way.h takes; and every loop of the headers ends (loops.py). Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
out=build/steady
eig='rolni_eig_iterate rolni_eig_reduce rolni_eig_sort rolni_eig_sweep rolni_rotate rolni_rotate2
     roln_exp_dd1 roln_expm1 roln_sinhc'
passed=0
failed=0
rm -rf $out
check() { # text command ..
    text=$1
    shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $text"; fi
}
# model states weights: what moves
one() {
    top=$PWD
    mkdir -p $out/"$1"
    gcc -std=c99 -O1 -ffp-contract=off -I. -Iexamples -Itests/measure -DMODEL="$1" tests/measure/weights.c \
        -o $out/"$1"/weights -lm && $out/"$1"/weights < "$3".roln > $out/"$1"/"$1"_weights.h || return 1
    (cd $out/"$1" && gcc -std=c99 -D_POSIX_C_SOURCE=200809L -O0 --coverage -ffp-contract=off -DROLN_SIMD=0 -DWORST -DMODEL="$1" \
        -I"$top" -I"$top"/examples -I"$top"/tests/measure -I. "$top"/tests/measure/firmware.c "$top"/tests/safety/steady.c \
        -o steady -lm 2> build.log) || { cat $out/"$1"/build.log; return 1; }
    python3 tests/safety/steady.py $out/"$1" "$2" > $out/"$1"/moved
}
for model in 'pend16 24 tests/mujoco/models/pend16' 'cloth 8 tests/experiments/weights/cloth-free-layers-1'; do
    name=${model%% *}
    check "$name: not measured" one $model
    for what in tick ahead filter observe; do
        for f in $eig; do
            echo "$what $f"
        done
        [ $what = filter ] && echo 'filter roln_exp_dd2' && echo 'filter rolni_reflect'
    done | sort > $out/"$name"/want
    sort $out/"$name"/moved > $out/"$name"/got
    check "$name: other functions depend on numbers" diff $out/"$name"/want $out/"$name"/got
done
python3 tests/safety/loops.py roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h > $out/loops
check 'a loop without a bound' [ $? -eq 0 ]
cat $out/loops | sed '$d'
loops=$(sed -n '$s/ passed.*//p' $out/loops)
echo "$((passed + loops)) passed, $failed failed"
[ $failed -eq 0 ]
