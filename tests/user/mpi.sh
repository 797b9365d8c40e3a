#!/bin/sh
# SPDX-License-Identifier: MIT
# The trainer on several processes (mpirun): the weights of 1 to 4 processes, of 1 and 2 threads each, are those of the program
# without MPI, to the bit: with a regression and windows, with a chart and polynomials, with Adam; with all recordings in all
# processes, and with spread=. A process that dies ends the training, and --resume goes on. Mistakes are said once.
cd "$(dirname "$0")/../.." || exit 1
dir=build/mpi
. tests/user/check.sh
export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1

# two joints with a spring between them; and the same motion, without torques, seen through three joints
printf '#define ROLN_NAME two\n#define ROLN_AE 2\n#define ROLN_MLP 8\n#include "roln.h"\n' > $dir/two.h
printf '#define ROLN_NAME bent\n#define ROLN_AE 3, 2\n#define ROLN_CHART polynomial, 2\n' > $dir/bent.h
printf '#define ROLN_POLYNOMIALS 2, 3\n#define ROLN_MASS squares, 2\n#include "roln.h"\n' >> $dir/bent.h
flags='-std=c99 -O2 -march=native -fno-math-errno -ffp-contract=off'
for m in two bent; do
    # shellcheck disable=SC2086 # several words
    { gcc $flags -I. -I$dir -Iexamples -DMODEL=$m examples/train.c -o $dir/$m -lpthread -lm &&
        mpicc $flags -DROLN_MPI -I. -I$dir -Iexamples -DMODEL=$m examples/train.c -o $dir/${m}_mpi -lpthread -lm; } || exit 1
done

# motion SEED RECORDINGS: t, q, qd, tau of two joints; of different lengths
motion() {
    awk -v seed="$1" -v recordings="$2" 'BEGIN {
        srand(seed)
        print "t,q1,q2,qd1,qd2,tau1,tau2"
        for (k = 0; k < recordings; k++) {
            a = rand() - 0.5; b = rand() - 0.5; u = 0; v = 0; w = 1 + rand()
            if (k > 0) print ""
            for (i = 0; i < 160 + 40 * (k % 3); i++) {
                x = sin(w * i * 0.02); y = cos(1.3 * w * i * 0.02)
                printf "%.2f,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", i * 0.02, a, b, u, v, x, y
                for (j = 0; j < 40; j++) { # the torque is held
                    u += (x - 3 * sin(a) - (a - b)) * 0.00025 / 2; v += (y - 2 * sin(b) - (b - a)) * 0.00025
                    a += u * 0.0005; b += v * 0.0005
                    u += (x - 3 * sin(a) - (a - b)) * 0.00025 / 2; v += (y - 2 * sin(b) - (b - a)) * 0.00025
                }
            }
        } }'
}
# bend: what three joints show of it
bend() {
    awk -F, 'NR == 1 { print "t,q1,q2,q3,qd1,qd2,qd3"; next } NF == 0 { print; next }
        { printf "%s,%s,%s,%.9g,%s,%s,%.9g\n", $1, $2, $3, $2 + $2 * $3 / 2, $4, $5, $4 + ($4 * $3 + $2 * $5) / 2 }'
}
mkdir -p $dir/more $dir/bent_more
motion 1 6 > $dir/two.csv
bend < $dir/two.csv > $dir/bent.csv
for k in 1 2 3 4 5; do
    motion 1$k $k > $dir/more/$k.csv
    bend < $dir/more/$k.csv > $dir/bent_more/$k.csv
done

# on PROCESSES PROGRAM ARGUMENTS ..: processes that wait for each other in vain are ended after ten minutes
on() {
    many=$1 binary=$dir/${2}_mpi
    shift 2
    mpirun --timeout 600 --oversubscribe --bind-to none -n "$many" "$binary" "$@"
}
# same NAME PROGRAM ARGUMENTS ..: without MPI, and on 1 to 4 processes, each of one thread, and two of two
same() {
    name=$1 program=$2
    shift 2
    $dir/$program "$@" threads=2 out=$dir/$name > $dir/$name.log 2>&1
    check "$name, without MPI: ended with $?" test -s $dir/$name.roln
    for count in 1 2 3 4 22; do
        threads=1
        if [ $count = 22 ]; then count=2 threads=2; fi
        on $count $program "$@" threads=$threads out=$dir/$name.$count$threads > $dir/$name.$count$threads.log 2>&1
        check "$name, $count processes of $threads: ended with $?" cmp $dir/$name.roln $dir/$name.$count$threads.roln
    done
}
same joints two $dir/two.csv torque=1 steps=12 window=0.2
check 'windows' grep 'from here on windows of' $dir/joints.log
same joints_spread two $dir/two.csv torque=1 steps=12 window=0.2 spread=$dir/more
check 'spread' grep 'spread=: 5 files, 15 recordings, ' $dir/joints_spread.41.log
check 'spread counts' sh -c "! cmp $dir/joints.roln $dir/joints_spread.roln"
same chart bent $dir/bent.csv steps=4
same chart_spread bent $dir/bent.csv steps=4 spread=$dir/bent_more/1.csv,$dir/bent_more/3.csv,$dir/bent_more/5.csv
check 'the sums of the chart hold spread=' sh -c "
    grep 'chart: the decoder' $dir/chart.log > $dir/a; grep 'chart: the decoder' $dir/chart_spread.log > $dir/b
    ! cmp $dir/a $dir/b"
same adam two $dir/two.csv method=adam acc=30 spread=$dir/more/5.csv
check 'one process alone prints' test "$(grep -c '^wrote ' $dir/joints.41.log)" -eq 1
for what in errors.csv limits.h; do
    check "$what of 4 processes" cmp $dir/joints_spread_$what $dir/joints_spread.41_$what
done

# ends: COUNT, WORDS, times that they are said, ARGUMENTS ..: the run ends with 1
ends() {
    count=$1 words=$2
    shift 2
    on $count two "$@" > $dir/ends.log 2>&1
    [ $? -eq 1 ] && [ "$(grep -c "$words" $dir/ends.log)" -eq 1 ] || { head -n 20 $dir/ends.log; false; }
}
cp -r $dir/more $dir/bad
sed '7s/,/,x/' $dir/more/4.csv > $dir/bad/4.csv
check 'a file of spread= is broken' ends 3 'bad/4.csv:7: ' $dir/two.csv torque=1 spread=$dir/bad out=$dir/b
check 'a file of spread= is missing' ends 2 'more/none.csv' $dir/two.csv torque=1 spread=$dir/more,$dir/more/none.csv out=$dir/b
check 'a file of spread= twice' ends 2 'have the same samples' $dir/two.csv torque=1 spread=$dir/more,$dir/more/4.csv out=$dir/b
check 'a file of spread= that is trained with already' ends 2 'two.csv has the samples of a file that is read already' \
    $dir/two.csv torque=1 spread=$dir/two.csv,$dir/more out=$dir/b
check 'the same, with two files before it' ends 2 '4.csv has the samples of a file that is read already' \
    $dir/two.csv $dir/more/4.csv torque=1 spread=$dir/more out=$dir/b
# beside a file whose steps jitter all are brought to one rate, so the samples of two.csv become others than alone
awk -F, -v OFS=, 'NF > 1 && NR > 1 { $1 += NR % 3 * 0.0005 } 1' $dir/more/2.csv > $dir/jitter.csv
check 'a file of spread= that is trained with already, at another rate' ends 2 \
    'two.csv has the samples of a file that is read already' $dir/two.csv $dir/jitter.csv torque=1 spread=$dir/two.csv out=$dir/b
# a checkpoint is of the recordings of spread=, with their torques and where they begin
brief='torque=1 steps=4'
cp $dir/more/3.csv $dir/changing.csv
$dir/two $dir/two.csv $brief spread=$dir/changing.csv out=$dir/c > $dir/c.log 2>&1
for change in 'NF > 1 && NR > 1 { $6 = -$6 }' 'NR == 60 { print "" }'; do
    awk -F, -v OFS=, "$change 1" $dir/more/3.csv > $dir/changing.csv
    check "spread= changed, $change" sh -c "! $dir/two $dir/two.csv $brief spread=$dir/changing.csv out=$dir/c --resume \
        > $dir/ends.log 2>&1 && grep 'c.check is of other data' $dir/ends.log"
done
# recordings of spread= that are too short are told
{ cat $dir/more/2.csv; echo; sed -n '2,3p' $dir/more/3.csv; } > $dir/short.csv
$dir/two $dir/two.csv torque=1 steps=1 spread=$dir/short.csv out=$dir/b > $dir/b.log 2>&1
check 'a short recording of spread=' grep '^1 recordings of fewer than 3 samples: not used' $dir/b.log
# the range of an angle is an arc on any turn: 2.9 .. 3.5 and 2.7 .. 3.4 are 2.7 .. 3.5, also on two machines
sed 's/two$/hinge/; s/MLP/ANGLES 1, 1\n#define ROLN_MLP/' $dir/two.h > $dir/hinge.h
# shellcheck disable=SC2086 # several words
{ gcc $flags -I. -I$dir -Iexamples -DMODEL=hinge examples/train.c -o $dir/hinge -lpthread -lm &&
    mpicc $flags -DROLN_MPI -I. -I$dir -Iexamples -DMODEL=hinge examples/train.c -o $dir/hinge_mpi -lpthread -lm; } || exit 1
# arc FROM TO: recordings of two joints that swing between these angles
arc() {
    awk -v from="$1" -v to="$2" 'BEGIN {
        print "t,q1,q2,qd1,qd2"
        for (k = 0; k < 12; k++) for (i = 0; i < 120; i++) {
            w = 2 + k / 10; m = (from + to) / 2; c = (to - from) / 2; x = w * i * 0.02
            printf "%s%.2f,%.9g,%.9g,", k && !i ? "\n" : "", i * 0.02, m + c * sin(x), c * cos(x)
            printf "%.9g,%.9g\n", c * w * cos(x), -c * w * sin(x)
        } }'
}
mkdir -p $dir/arcs
arc 2.9 3.5 > $dir/turn.csv
arc 2.7 3.4 > $dir/arcs/1.csv
arc 3.1 3.3 > $dir/arcs/2.csv
same arc hinge $dir/turn.csv steps=1 spread=$dir/arcs
cat > $dir/arc.c << 'end'
#include "hinge.h"
#include "arc_weights.h"
#include <stdio.h>
int main(void)
{
    printf("%.3f %.3f\n", (double)hinge_weights.z_min[0], (double)hinge_weights.z_max[0]);
    return 0;
}
end
gcc -std=c99 -I. -I$dir $dir/arc.c -o $dir/arc_range -lm
check 'the range of an angle' sh -c "$dir/arc_range | awk '{ w = \$2 - \$1; print; exit !(w > 0.78 && w < 0.82) }'"

other="$dir/two_mpi $dir/two.csv torque=1 out=$dir/b"
for setting in seed=2 steps=3 next=1; do
    mpirun -n 1 $other : -n 1 $other $setting > $dir/ends.log 2>&1
    check "$setting in one process: ended" test $? -eq 1
    check "$setting in one process" grep '^process 1 has other recordings, settings or another config' $dir/ends.log
done

# names and units of columns in spread= are compared with those of the first file
named='q=pos* qd=vel* tau=torque* torque=1 steps=4'
head='t,posA,posB,velA,velB,torqueA,torqueB'
sed "1s/.*/$head/" $dir/two.csv > $dir/named.csv
sed "1s/.*/$head/" $dir/more/2.csv > $dir/ordered.csv
awk -F, -v OFS=, 'NF > 0 { print $1, $3, $2, $5, $4, $7, $6; next } { print }' $dir/ordered.csv > $dir/swapped.csv
for way in ordered swapped; do
    $dir/two $dir/named.csv $named spread=$dir/$way.csv out=$dir/$way > $dir/$way.log 2>&1
    check "$way columns" test -s $dir/$way.roln
done
check 'columns of spread= in the order of their names' cmp $dir/ordered.roln $dir/swapped.roln
sed '1s/pos./& [deg]/g' $dir/ordered.csv > $dir/degrees.csv
check 'another unit in spread=' ends 2 'column 2, q1, has the unit deg, but no unit in the first file' $dir/named.csv $named \
    spread=$dir/degrees.csv out=$dir/b
check 'spread= and noise=' ends 2 'spread= and noise=: not together' $dir/two.csv torque=1 spread=$dir/more noise=0.1 out=$dir/b
check 'an unknown setting is said once' ends 3 'unknown setting ape' $dir/two.csv ape=1
check 'no recordings' ends 2 'cannot read' $dir/nothing.csv
check 'no checkpoint' ends 2 'to go on from' $dir/two.csv torque=1 --resume out=$dir/none

# process 1 of 2 is killed in the middle of a training, mpirun ends, and other processes go on
long="$dir/two.csv torque=1 steps=40 window=0.2 spread=$dir/more"
$dir/two $long out=$dir/whole > $dir/whole.log 2>&1
# begin PROCESSES NAME: in the background, until it has a checkpoint of a later step than the first
begin() {
    : > $dir/$2.log
    on "$1" two $long out=$dir/$2 > $dir/$2.log 2>&1 &
    runner=$!
    until [ "$(grep -c E_q $dir/$2.log 2> /dev/null)" -ge 3 ] || ! kill -0 $runner; do sleep 0.05; done
}
# children of mpirun in the order of their ranks
begin 2 torn
set -- $(pgrep -P "$(pgrep -n -f "^mpirun .*out=$dir/torn\$")")
kill -KILL "$2"
wait $runner
code=$?
check "a process dies: ended with $code" test $code -ne 0
check 'and that is said' grep 'signal 9 (Killed)' $dir/torn.log
check 'no process is left' sh -c "sleep 0.5; ! pgrep -f out=$dir/torn\\\$"
check 'no weights of it' test ! -e $dir/torn.roln
on 3 two $long out=$dir/torn --resume > $dir/resumed.log 2>&1
check 'it goes on' grep '^on from step' $dir/resumed.log
check 'with the same bits' cmp $dir/whole.roln $dir/torn.roln

# SIGUSR1, which mpirun passes on, ends a training with its tables
begin 2 told
kill -USR1 "$(pgrep -n -f "^mpirun .*out=$dir/told\$")"
wait $runner
check 'a signal' grep '^ended by signal' $dir/told.log
check 'a signal: weights' test -s $dir/told.roln
$dir/two $long out=$dir/told --resume > $dir/resumed.log 2>&1
check 'the program without MPI goes on' cmp $dir/whole.roln $dir/told.roln

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
