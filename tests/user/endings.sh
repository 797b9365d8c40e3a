#!/bin/sh
# SPDX-License-Identifier: MIT
# However a training ends, it keeps what it has, says why, and goes on with the same bits: killed, by a signal, by seconds=, without
# memory, disk or finite numbers, with another number of threads; and a checkpoint of something else is refused.
cd "$(dirname "$0")/../.." || exit 1
dir=build/endings
. tests/user/trainings.sh
$dir/joints $dir/2_train.csv steps=30 held=0.3 out=$dir/j > $dir/j.log

# killed after some looks, resumed with another number of threads: the same bits
for m in chart layers; do
    method=
    [ $m = layers ] && method="method=adam acc=400"
    run="$dir/$m $dir/16_train.csv steps=30 ae=400 $method"
    $run out=$dir/whole > $dir/whole.log 2>&1
    rm -f $dir/cut*
    : > $dir/cut.log
    $run out=$dir/cut > $dir/cut.log 2>&1 &
    until [ "$(grep -c E_q $dir/cut.log 2> /dev/null)" -ge 4 ]; do sleep 0.1; done
    kill -9 $!
    wait $! 2> /dev/null
    check "$m: killed, so no weights" test ! -e $dir/cut.roln
    $run out=$dir/cut --resume threads=3 > $dir/cut.log 2>&1
    check "$m: resumed" grep '^on from step' $dir/cut.log
    check "$m: the same bits" cmp $dir/whole.roln $dir/cut.roln
    cat $dir/cut.log
done
check 'more steps' short $dir/chart $dir/16_train.csv steps=32 ae=400 out=$dir/whole.more
check 'layers, then Gauss-Newton' short $dir/layers $dir/16_train.csv steps=2 ae=100 out=$dir/c
check 'from packed weights' short $dir/layers $dir/16_train.csv steps=1 ae=0 out=$dir/d from=$dir/c.roln
{ cat $dir/c.roln; echo; } > $dir/longer.roln
head -c 1000 $dir/c.roln > $dir/shorter.roln
for m in longer shorter; do
    check "packed weights, $m" says 'cannot start from .*it is cut off, or goes on behind its end' \
        $dir/layers $dir/16_train.csv steps=1 ae=0 out=$dir/d from=$dir/$m.roln
done
check 'another start than that of the checkpoint' \
    says 'other settings' $dir/layers $dir/16_train.csv steps=1 ae=0 resume=1 out=$dir/d from=$dir/whole.roln
for word in start=random ignore=none sliders=1 method=adam; do
    check "another $word than that of the checkpoint" \
        says 'other settings' $dir/layers $dir/16_train.csv steps=1 ae=0 resume=1 out=$dir/d from=$dir/c.roln $word
done
mkdir $dir/steep
sed 's/^#include/#define ROLN_SLOPE 0.5\n#include/' $dir/layers.h > $dir/steep/layers.h
gcc -std=c99 -O1 -I. -I$dir/steep -DMODEL=layers examples/train.c -o $dir/steeper -lpthread -lm
check 'another slope than that of the checkpoint' \
    says 'another config' $dir/steeper $dir/16_train.csv steps=1 ae=0 resume=1 out=$dir/d from=$dir/c.roln
awk -F, -v OFS=, 'NR > 1 && NF > 1 { $1 *= 1.05 } 1' $dir/16_train.csv > $dir/slower.csv
check 'another time step than that of the checkpoint' \
    says 'other data' $dir/layers $dir/slower.csv steps=1 ae=0 resume=1 out=$dir/d from=$dir/c.roln
check 'nothing to train' short $dir/layers $dir/16_train.csv method=adam ae=0 acc=0 out=$dir/n
check 'a wall in seconds' short $dir/layers $dir/16_train.csv seconds=4 out=$dir/e
check 'noise, smoothed' short $dir/chart $dir/16_train.csv steps=1 noise=0.01 smooth=15 out=$dir/f
check 'other settings than those of the checkpoint' says 'other settings' $dir/chart $dir/16_train.csv resume=1 out=$dir/whole.more
awk -F, -v OFS=, 'NR == 5 { $2 += 1e-6 } 1' $dir/16_train.csv > $dir/other.csv
check 'other recordings than those of the checkpoint' \
    says 'other data' $dir/chart $dir/other.csv steps=33 ae=400 resume=1 out=$dir/whole.more
# a checkpoint is kept, and not taken if it is damaged
cp $dir/whole.more.check $dir/torn.check
dd if=/dev/zero of=$dir/torn.check bs=1 seek=20000 count=2000 conv=notrunc 2> /dev/null
cp $dir/torn.check $dir/torn.was
check 'a damaged checkpoint' says 'torn.check is damaged' $dir/chart $dir/16_train.csv steps=33 ae=400 resume=1 out=$dir/torn
check 'a damaged checkpoint stays' cmp $dir/torn.check $dir/torn.was
{ cat $dir/whole.more.check; echo; } > $dir/longer.check
check 'a checkpoint that goes on behind its end' \
    says 'longer.check is damaged' $dir/chart $dir/16_train.csv steps=33 ae=400 resume=1 out=$dir/longer
check 'no checkpoint' says 'there is no .*/none.check to go on from' $dir/chart $dir/16_train.csv steps=33 resume=1 out=$dir/none
check 'over a checkpoint' short $dir/layers $dir/16_train.csv steps=1 ae=0 out=$dir/torn
check 'the checkpoint before is kept' cmp $dir/torn.check.old $dir/torn.was
cp $dir/torn.was $dir/torn.check
check 'data that does not begin' says 'does not move' sh -c "
    awk -F, -v OFS=, 'NR > 1 && NF { for (i = 2; i <= NF; i++) \$i = 0 } 1' $dir/16_train.csv > $dir/still.csv
    $dir/layers $dir/still.csv steps=1 ae=0 out=$dir/torn"
check 'a training that does not begin moves no checkpoint' cmp $dir/torn.check $dir/torn.was
check 'those of the checkpoint' short $dir/chart $dir/16_train.csv steps=33 ae=400 resume=1 out=$dir/whole.more

check 'seconds=' wall 3 stops $dir/joints $dir/2_train.csv test=$dir/2_test.csv seconds=3 out=$early
check 'seconds=: windows begin at half of it' grep '^from here on windows of 25 steps of 0.02 s' $dir/says.log
check 'seconds=: weights' test -s $early.roln
check 'seconds=: tables' test "$(grep -c 'worst joint' $dir/says.log)" -eq 2
check 'seconds=, with --resume' wall 3 stops $dir/joints $dir/2_train.csv test=$dir/2_test.csv seconds=3 out=$early --resume
check 'seconds=, with --resume: goes on' awk '/^on from step/ { from = $4 } /^ended by/ { ok = $NF > from && from > 0 }
    END { exit !ok }' $dir/says.log
check 'seconds= of sixteen joints' wall 6 stops $dir/chart $dir/16_train.csv seconds=6 out=$early

# a signal; then on to the bits of a training without one
for signal in INT TERM HUP; do
    rm -f $early.*
    : > $early.log
    $dir/joints $dir/2_train.csv steps=30 held=0.3 out=$early > $early.log 2>&1 &
    looks early 4
    kill -$signal $!
    wait $!
    check "SIG$signal: ended with $?" test $? -eq 3
    check "SIG$signal: says so" grep '^no trained model: ended by signal [0-9]* at step [0-9]*: before windows' $early.log
    check "SIG$signal: weights" left early 'ended by signal'
done
check 'a signal: on with the same bits' sh -c "
    $dir/joints $dir/2_train.csv steps=30 held=0.3 out=$early --resume > $early.log 2>&1
    [ \$? -eq 3 ] && cmp $early.roln $dir/j.roln"
rm -f $early.* ${early}_*
check 'a pipe that is closed' sh -c "$dir/joints $dir/2_train.csv steps=5 out=$early | head -n 1 && test -s $early.roln"

# numbers that overflow: in a few samples, in all
awk -F, -v OFS=, '/^$/ { k++; i = 0 } NR > 1 && NF && i++ == 1000 && k % 2 == 1 { $6 = 1e30 } 1' $dir/2_train.csv \
    > $dir/wild_train.csv
check 'wild samples to train with' ends 3 'ended by steps=60 at step 60: before windows' \
    $dir/joints $dir/wild_train.csv torque=1 start=random steps=60 held=0.3 out=$early
awk -F, -v OFS=, 'NR > 1 && NF { $6 = $7 = 1e38 } 1' $dir/small.csv > $dir/file.csv # which are numbers in a unit of their own
rm -f $early.* ${early}_*
check 'torques that overflow' ends 3 'ended by a failure (residuals of training samples overflow; possible cause: .*at step 4' \
    $dir/joints $dir/file.csv torque=1 inertia=1 out=$early
check 'torques that overflow: the start is no model' grep 'no step predicts better than the weights before it' $dir/says.log
check 'torques that overflow: weights' left early 'ended by a failure'
check 'torques that overflow, with --resume' ends 3 'ended by a failure (.*at step 8' \
    $dir/joints $dir/file.csv torque=1 inertia=1 out=$early --resume
check 'torques that overflow, Adam' ends 3 'ended by a failure (1000 updates in a row were refused' \
    $dir/joints $dir/file.csv torque=1 inertia=1 method=adam acc=5000 out=$early

# files that cannot be written: before a training it ends, in the middle it goes on
mkdir $dir/taken_weights.h
check 'a file that cannot be written' says 'cannot write .*taken_weights.h' $dir/joints $dir/2_train.csv out=$dir/taken
rm -f $early.* ${early}_*
check 'a file that is too large' says 'cannot write .*early.part: ' sh -c "ulimit -f 8; exec $dir/joints $dir/small.csv out=$early"
check 'a file that is too large: nothing is left of it' test ! -e $early.part
: > $early.log
$dir/joints $dir/2_train.csv steps=30 held=0.3 out=$early > $early.log 2>&1 &
looks early 2
for f in $early.check $early.svg; do
    until rm -f $f && mkdir $f 2> /dev/null; do :; done # it may be written between the two
done
wait $!
check "no checkpoint any more: ended with $?" test $? -eq 3
check 'no checkpoint any more: says so' grep '^warning: cannot write .*early.check: ' $early.log
check 'no checkpoint any more: the same bits' cmp $early.roln $dir/j.roln
rm -r $early.check $early.svg
# out of memory at the n-th request; the first one that the training itself makes, and later ones
cat > $dir/scarce.h << 'END_OF_FILE'
#define _POSIX_C_SOURCE 200809L
#include <stdlib.h>
static int requests;
static void *scarce(size_t count, size_t size)
{
    return getenv("REQUESTS") && ++requests > atoi(getenv("REQUESTS")) ? NULL : calloc(count, size);
}
#define calloc scarce
END_OF_FILE
gcc -std=c99 -O1 -I. -I$dir -include $dir/scarce.h -DMODEL=joints examples/train.c -o $dir/scarce -lpthread -lm
first=12
until REQUESTS=$first $dir/scarce $dir/small.csv steps=200 out=$early > $dir/says.log 2>&1; [ $? -eq 3 ] || [ $first -gt 200 ]; do
    first=$((first + 1))
done
for n in $first $((first + 5)) $((first + 20)); do
    rm -f $early.* ${early}_*
    check "out of memory: $n" ends 3 '^no trained model: the training ended at step' \
        env REQUESTS=$n $dir/scarce $dir/small.csv steps=200 out=$early
    check "out of memory: $n, says so" grep '^out of memory' $dir/says.log
    check "out of memory: $n, weights" left early 'not judged: '
done
n=12
until
    REQUESTS=$n $dir/scarce $dir/small.csv steps=200 out=$early --resume > $dir/says.log 2>&1
    code=$?
    grep -q '^on from step' $dir/says.log || [ $n -gt 200 ]
do
    n=$((n + 1))
done
check "out of memory behind --resume: ended with $code" test $code -eq 3
check 'out of memory behind --resume, says so' grep '^out of memory' $dir/says.log
check 'out of memory behind --resume, weights' left early 'not judged: '
check 'out of memory before the training' says 'out of memory' env REQUESTS=12 $dir/scarce $dir/small.csv out=$early

# weights of an interrupted training are kept; if they were good, they are kept beside worse ones, and these do not take their place
rm -f $early.* ${early}_*
check 'weights of an interrupted training' short $dir/joints $dir/small.csv steps=1 seed=1 out=$early
cp $early.roln $dir/interrupted
check 'another one over them' short $dir/joints $dir/small.csv steps=1 seed=2 out=$early
check 'another one over them: they are kept' cmp $early.roln.old $dir/interrupted
rm -f $early.* ${early}_*
echo good > $early.roln
echo good > ${early}_weights.h
echo good > ${early}_limits.h
for seed in 1 2; do
    check "worse than before: seed $seed" short $dir/joints $dir/small.csv steps=1 seed=$seed out=$early
    check "worse than before: seed $seed, the old ones" grep good $early.roln.old ${early}_weights.h.old ${early}_limits.h.old
done
# headers of weights and limits of two trainings do not compile together
for order in 'weights limits' 'limits weights'; do
    first=$dir/${order% *}.c
    echo '#include "joints.h"' > "$first"
    for header in $order; do
        echo "#include \"early_$header.h\"" >> "$first"
    done
    check "$order of one training" gcc -std=c99 -I. -I$dir -fsyntax-only -Werror "$first"
done
check 'others' short $dir/joints $dir/small.csv steps=1 seed=3 out=$dir/other
cp $dir/other_weights.h ${early}_weights.h
for first in weights limits; do
    check "weights and limits of two trainings, first the $first" sh -c "
        ! gcc -std=c99 -I. -I$dir -fsyntax-only $dir/$first.c 2> $dir/two.log &&
            grep 'are of two trainings: take both of one' $dir/two.log"
done
# one training at a time writes to a place
$dir/joints $dir/small.csv steps=100000 window=0 out=$early > $early.log 2>&1 &
until grep -q Gauss $early.log 2> /dev/null; do sleep 0.1; done
kill -STOP $! # while it writes its checkpoint, say
echo half > $early.part
check 'another training there' says "^out=$early: another training is writing these files" \
    $dir/joints $dir/small.csv steps=1 out=$early
check 'another training there: its files are as it left them' grep half $early.part
kill -CONT $!
kill -INT $!
wait $!
check 'another training there: the first one ends' grep '^wrote' $early.log
check 'behind it nothing is left of that' test ! -e $early.lock
check 'and its place is free' short $dir/joints $dir/small.csv steps=1 seed=2 out=$early

rm -rf $dir
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
