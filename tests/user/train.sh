#!/bin/sh
# From nothing to a model, as a user would: simulate chains with MuJoCo, export CSV, train with examples/train.c, and demand E_q
# below bounds on trajectories that it has not seen. A training that is killed and resumed ends with the same bits as one that is
# not, whatever the number of threads. What a user may get wrong is said, and ends with 1.
cd "$(dirname "$0")/../.." || exit 1
dir=build/train
rm -rf $dir
mkdir -p $dir
passed=0
failed=0
# check WHAT COMMAND ..: it succeeds
check() {
    what=$1
    shift
    if "$@" > $dir/check.log 2>&1; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$what"; cat $dir/check.log; fi
}
# below FILE HORIZON BOUND LOG: E_q in the table of FILE
below() {
    awk -v file="$1" -v ms="$2" -v bound="$3" '/[.]csv$/ { on = $1 == file } on && $1 == ms { e = $2 }
        END { print "E_q(" ms " ms) " e " %, bound " bound " %"; exit !(e ~ /^[0-9.]+$/ && e + 0 < bound) }' "$4"
}
# says WORDS COMMAND ..: it ends with 1, and says them
says() {
    words=$1
    shift
    "$@" > $dir/says.log 2>&1
    [ $? -eq 1 ] && grep "$words" $dir/says.log
}
cat > $dir/chart.h << 'END_OF_FILE'
#define ROLN_NAME chart
#define ROLN_AE 16, 4
#define ROLN_CHART polynomial, 4
#define ROLN_MLP 16, 16
#define ROLN_HORIZON 25
#include "roln.h"
END_OF_FILE
sed 's/chart$/layers/; s/16, 4/16, 8, 4/; /CHART/d' $dir/chart.h > $dir/layers.h
sed 's/chart$/joints/; s/16, 4/2/; /CHART/d' $dir/chart.h > $dir/joints.h
for m in chart layers joints; do
    gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -I$dir -DMODEL=$m examples/train.c -o $dir/$m \
        -lpthread -lm || exit 1
done
build/generate pend16 $dir/16.h5 --train 30 --test 5 --tune 1 --seed 1 --csv $dir/16 || exit 1
awk -F, -f tests/mujoco/mild.awk $dir/16_train.csv > $dir/16_mild.csv
build/generate pend2 $dir/2.h5 --train 10 --test 5 --tune 1 --seed 1 --csv $dir/2 || exit 1

# 16 joints, a chart, windows; without a chart POD leaves 20 %
$dir/chart $dir/16_mild.csv test=$dir/16_test.csv steps=120 out=$dir/a > $dir/a.log 2>&1
check "chart: ended with $?" test $? -eq 0
cat $dir/a.log
check 'chart alone' below $dir/16_test.csv 0 0.05 $dir/a.log
check 'prediction' below $dir/16_test.csv 25 0.5 $dir/a.log
check 'windows' grep 'windows of 25 steps of 0.02 s' $dir/a.log
check 'error bars' awk '/_test[.]csv$/ { on = 1 } on && $1 == 1000 { ok = $3 > 0 && $3 < $2 } END { exit !ok }' $dir/a.log
check 'learning curve' awk '/<path fill/ { n++; ok += gsub(/L/, "") > 10 } END { exit !(n == 2 && ok == 2) }' $dir/a.svg

# a chart or layers: both are trained, and the better one is named first
(cd $dir && CC=gcc sh ../../examples/train.sh 16_mild.csv layers chart steps=15 ae=500) > $dir/e.log 2>&1
check "several configs: ended with $?" test $? -eq 0
check 'the better config first' \
    awk '/^chart: held-out/ { c = ++n } /^layers: held-out/ { l = ++n } END { exit !(c == 1 && l == 2) }' $dir/e.log

# until held-out trajectories are predicted no better, in the end with the best weights
$dir/joints $dir/2_train.csv test=$dir/2_test.csv out=$dir/b held=0.2 window=0 > $dir/b.log 2>&1
check "stops by itself: ended with $?" test $? -eq 0
cat $dir/b.log
check 'two joints' below $dir/2_test.csv 1000 1 $dir/b.log

# killed after some looks, resumed with another number of threads: the same bits
for m in chart layers; do
    method=
    [ $m = layers ] && method="method=adam acc=400"
    run="$dir/$m $dir/16_train.csv steps=30 ae=400 $method"
    $run out=$dir/whole > $dir/whole.log 2>&1
    rm -f $dir/cut*
    $run out=$dir/cut > $dir/cut.log 2>&1 &
    until [ "$(grep -c E_q $dir/cut.log 2> /dev/null)" -ge 4 ]; do sleep 0.1; done
    kill -9 $!
    wait $! 2> /dev/null
    check "$m: killed, so no weights" test ! -s $dir/cut.roln
    $run out=$dir/cut resume=1 threads=3 > $dir/cut.log 2>&1
    check "$m: resumed" grep '^on from step' $dir/cut.log
    check "$m: the same bits" cmp $dir/whole.roln $dir/cut.roln
    cat $dir/cut.log
done
check 'more steps' $dir/chart $dir/16_train.csv steps=32 ae=400 out=$dir/whole.more
check 'layers, then Gauss-Newton' $dir/layers $dir/16_train.csv steps=2 ae=100 out=$dir/c
check 'from packed weights' $dir/layers $dir/16_train.csv steps=1 ae=0 out=$dir/d from=$dir/c.roln
check 'another start than that of the checkpoint' \
    says 'other settings' $dir/layers $dir/16_train.csv steps=1 ae=0 resume=1 out=$dir/d from=$dir/whole.roln
check 'a wall in seconds' $dir/layers $dir/16_train.csv seconds=4 out=$dir/e
check 'noise, smoothed' $dir/chart $dir/16_train.csv steps=1 noise=0.01 smooth=15 out=$dir/f
check 'other settings than those of the checkpoint' says 'other settings' $dir/chart $dir/16_train.csv resume=1 out=$dir/whole.more
sed 's/,0[.]1/,0.2/' $dir/16_train.csv > $dir/other.csv
check 'other recordings than those of the checkpoint' \
    says 'other data' $dir/chart $dir/other.csv steps=33 ae=400 resume=1 out=$dir/whole.more
check 'those of the checkpoint' $dir/chart $dir/16_train.csv steps=33 ae=400 resume=1 out=$dir/whole.more
check 'unknown setting' says 'unknown setting ape' $dir/chart $dir/16_train.csv ape=1
check 'no key' says 'not key=value' $dir/chart $dir/16_train.csv ape
check 'no number' says 'not a number' $dir/chart $dir/16_train.csv held=much
check 'negative' says 'at least 0' $dir/chart $dir/16_train.csv look=-1
check 'nothing held out' says 'held out are needed' $dir/chart $dir/16_train.csv held=0
check 'nothing left' says 'held out are needed' $dir/chart $dir/16_train.csv held=1
$dir/joints $dir/2_train.csv steps=1 look=0 out=$dir/h > $dir/h.log 2>&1
check 'one held out: no standard error' grep '+- - %' $dir/h.log
check 'look: a step at least' grep 'after 0.005 s' $dir/h.log
check 'method' says 'newton or adam' $dir/chart $dir/16_train.csv method=sgd
check 'threads' says '1 .. 16' $dir/chart $dir/16_train.csv threads=0
check 'no torques' says 'no tau columns' sh -c "cut -d, -f1-33 $dir/16_train.csv > $dir/free.csv; $dir/chart $dir/free.csv torque=1"
check 'other columns' says 'columns, but joints needs' $dir/joints $dir/16_train.csv
check 'no file' says 'cannot read' $dir/chart $dir/nothing.csv
check 'no place' says 'cannot write' $dir/chart $dir/16_train.csv out=$dir/nowhere/a
check 'no weights' says 'cannot start from' $dir/layers $dir/16_train.csv from=$dir/16.h5 out=$dir/g
rm -rf $dir
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
