#!/bin/sh
# SPDX-License-Identifier: MIT
# next.sh - does it pay to choose recordings? pend16: models of 193 recordings from random starts, of 100, of 50, and of 50 and 50
# more whose starts the trainer has chosen (next=) with a model of the 50 after 120 s. Trained for SECONDS on one core each, JOBS at
# a time, with seeds 1 to 3. Tables are of 20 other recordings. What is there is not trained again. Run by `make next`; logs in
# build/next16.
#
#   next.sh SECONDS          all, then the table
#   next.sh SECONDS SEED     one seed, without the table
set -e
. tests/experiments/means.sh
dir=build/next16
seconds=${1:-300}
mkdir -p $dir
# mild FILE: without the recordings in which the last block whips round
mild() { awk -F, -f tests/mujoco/mild.awk "$1"; }
# first COUNT FILE: so many recordings
first() { awk -v count="$1" '/^$/ && ++n == count { exit } { print }' "$2"; }
# trained NAME FILE SETTING ..: its log is NAME.log
trained() {
    name=$dir/$1 file=$dir/$2
    shift 2
    run "$name.log" "$dir/train" "$file" threads=1 out="$name" "$@"
}

if [ $# -eq 2 ]; then
    seed=$2
    trained "first-$seed" 50.csv seed="$seed" seconds=120 next=50
    [ -s "$dir/all-$seed.csv" ] || {
        build/generate pend16 "$dir/more-$seed.h5" --starts "$dir/first-${seed}_next.csv" --test 1 --tune 1 --seed "2$seed" \
            --csv "$dir/more-$seed" > "$dir/more-$seed.log"
        mild "$dir/more-${seed}_train.csv" | { cat $dir/50.csv; sed 1s/.*//; } > "$dir/all-$seed.csv"
    }
    for row in 193 100 50 all; do
        [ $row = all ] && file=all-$seed || file=$row
        trained "$row-$seed" "$file.csv" test=$dir/test.csv seed="$seed" seconds="$seconds"
    done
    exit
fi
gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples -DMODEL=pend16 examples/train.c \
    -o $dir/train -lpthread -lm
build/generate pend16 $dir/r.h5 --train 205 --test 21 --tune 1 --seed 1 --csv $dir/r > $dir/r.log
mild $dir/r_train.csv > $dir/mild.csv
for n in 193 100 50; do first $n $dir/mild.csv > $dir/$n.csv; done
mild $dir/r_test.csv > $dir/test.csv
printf '%s\n' 1 2 3 | xargs -P "${JOBS:-1}" -I SEED sh "$0" "$seconds" SEED
count() { awk '/^$/ { n++ } END { print n - 49 }' "$1"; }
means_heading 24
for row in 193 100 50 all; do
    name=$row
    [ $row != all ] || name="50 and $(for seed in 1 2 3; do count "$dir/all-$seed.csv"; done | paste -sd /) chosen"
    means 24 "$name" $dir/$row-1.log $dir/$row-2.log $dir/$row-3.log
done
