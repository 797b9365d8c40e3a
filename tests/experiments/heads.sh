#!/bin/sh
# SPDX-License-Identifier: MIT
# heads.sh - M and V as networks and as polynomials: two configs for each system, which differ in nothing else, trained with the
# trainer's defaults on one core each, JOBS at a time, with seeds 1 to 3. Tables are of other recordings. What is there is not
# trained again. Run by `make heads`; logs in build/heads.
#
#   heads.sh              all, then the table
#   heads.sh RUN          one training, such as pend16-193-polynomials-1
set -e
. tests/experiments/means.sh
dir=build/heads
mkdir -p $dir
# rows: name, recordings, seconds, settings of the trainer
rows='pend16 193 300
pend16 20 60
wave16 193 300
pend2 40 30 torque=1
turning 40 30 torque=1'

if [ $# -eq 1 ]; then
    IFS=- read -r system count head seed << END
$1
END
    settings=$(echo "$rows" | awk -v s="$system" -v c="$count" '$1 == s && $2 == c { print "seconds=" $3, $4 }')
    # shellcheck disable=SC2086
    run "$dir/$1.log" "$dir/$system-$head" "$dir/$system-$count.csv" test="$dir/$system-test.csv" threads=1 seed="$seed" \
        out="$dir/$1" $settings
    exit
fi

# config SYSTEM HEAD LINE ..
config() {
    name=$1_$2 program=$dir/$1-$2
    shift 2
    {
        printf '#define ROLN_NAME %s\n' "$name"
        printf '#define ROLN_%s\n' "$@"
        printf '#define ROLN_HORIZON 25\n#include "roln.h"\n'
    } > "$dir/$name.h"
    gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples -I$dir -DMODEL="$name" examples/train.c \
        -o "$program" -lpthread -lm
}
for system in pend16 wave16; do
    [ $system = pend16 ] && degree=4 || degree=6
    config $system networks 'AE 16, 4' "CHART polynomial, $degree" 'MLP 32, 32'
    config $system polynomials 'AE 16, 4' "CHART polynomial, $degree" 'POLYNOMIALS 4, 7' 'MASS squares, 6'
    build/generate $system $dir/$system.h5 --train 205 --test 21 --tune 1 --seed 1 --csv $dir/$system > $dir/$system.log
    awk -F, -f tests/mujoco/mild.awk $dir/${system}_train.csv > $dir/mild.csv
    awk -F, -f tests/mujoco/mild.awk $dir/${system}_test.csv > $dir/$system-test.csv
    for count in 193 20; do
        awk -v count=$count '/^$/ && ++n == count { exit } { print }' $dir/mild.csv > $dir/$system-$count.csv
    done
done
for system in pend2 turning; do # seed 7: joint 2 turns over in some recordings of both sets
    [ $system = pend2 ] && seed=1 || seed=7
    config $system networks 'AE 2' 'ANGLES 1, 1' 'MLP 32, 32'
    config $system polynomials 'AE 2' 'ANGLES 1, 1' 'POLYNOMIALS 2, 3' 'MASS squares, 6'
    build/generate pend2_act $dir/$system.h5 --train 40 --test 21 --tune 1 --seed $seed --csv $dir/$system > $dir/$system.log
    mv $dir/${system}_train.csv $dir/$system-40.csv
    mv $dir/${system}_test.csv $dir/$system-test.csv
done
echo "$rows" | while read -r system count _; do
    for seed in 1 2 3; do
        for head in networks polynomials; do echo "$system-$count-$head-$seed"; done
    done
done | xargs -P "${JOBS:-1}" -I RUN sh "$0" RUN
means_heading 34
echo "$rows" | while read -r system count seconds _; do
    for head in networks polynomials; do
        name=$dir/$system-$count-$head
        means 34 "$system, $count, $seconds s, $head" "$name-1.log" "$name-2.log" "$name-3.log"
    done
done
