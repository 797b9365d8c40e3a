#!/bin/sh
# SPDX-License-Identifier: MIT
# next.sh - next=K: what to record next. Two coupled pendulums with motors, whose recordings begin on the same side of both: the
# recordings that are chosen begin where none was, what is written is a file of recordings, and a model of both is better.
cd "$(dirname "$0")/../.." || exit 1
dir=build/next
. tests/user/check.sh

printf '#define ROLN_NAME two\n#define ROLN_AE 2\n#define ROLN_MLP 8, 8\n#define ROLN_HORIZON 25\n#include "roln.h"\n' > $dir/two.h
gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -I$dir -Iexamples -DMODEL=two examples/train.c -o $dir/two \
    -lpthread -lm || exit 1
# record SEED SAME: 12 recordings of 0.3 s, whose q2 begins at the side of q1, SAME = 1, or at any, 0; record FILE: they begin where
# those of FILE do. M = 1, V = -10 cos q1 - 10 cos q2 - 5 cos(q1 - q2)
record() {
    awk -v seed="$1" -v same="$2" -F, '
        function move(k, a, b,    i, j, u, v, da, db) {
            for (i = 0; i < 300; i++) {
                u = 2 * sin(0.02 * i + 7 * k); v = 2 * cos(0.03 * i + 5 * k)
                printf "%.3f,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", 0.001 * i, a, b, da, db, u, v
                for (j = 0; j < 10; j++) {
                    da += 0.0001 * (u - 10 * sin(a) - 5 * sin(a - b)); db += 0.0001 * (v - 10 * sin(b) + 5 * sin(a - b))
                    a += 0.0001 * da; b += 0.0001 * db
                }
            }
            print ""
        }
        function drawn() { return 0.4 + rand() }
        BEGIN { print "t,q1,q2,qd1,qd2,tau1,tau2"; srand(seed)
            for (k = 0; k < 12 && same != ""; k++) {
                s = rand() < 0.5 ? -1 : 1; r = same ? s : rand() < 0.5 ? -1 : 1
                move(k, s * drawn(), r * drawn())
            } }
        $1 == "0" { move(k++, $2, $3) }' "$([ $# -eq 2 ] && echo /dev/null || echo "$1")"
}
record 1 1 > $dir/same.csv
record 2 1 | sed 1d > $dir/more.csv
record 3 0 > $dir/test.csv
# error LOG: E_q after 250 ms of the test
error() { awk '/test.csv$/ { on = 1 } on && $1 == 250 { print $2; exit }' "$1"; }
# other FILE: of its recordings, those that begin on other sides
other() { awk -F, '$1 == "0" { n += $2 * $3 < 0 } END { print n }' "$1"; }
recordings() { awk -F, '$1 == "0"' "$1" | wc -l; }

for t in 1 2; do
    $dir/two $dir/same.csv torque=1 held=0.2 steps=60 threads=$t next=12 out=$dir/a$t > $dir/a$t.log 2>&1
    check "a training: ended with $?" test -s $dir/a${t}_next.csv
done
grep '^next recordings' $dir/a1.log
echo "$(other $dir/a1_next.csv) of 12 begin where none did"
check 'two threads choose the same' cmp $dir/a1_next.csv $dir/a2_next.csv
check 'it says so' grep '^next recordings: 12 of 200 that were tried' $dir/a1.log
check 'so many' test "$(recordings $dir/a1_next.csv)" -eq 12
check 'the columns of a recording' test "$(head -n 1 $dir/a1_next.csv)" = "$(head -n 1 $dir/same.csv)"
check 'they begin where none did' test "$(other $dir/a1_next.csv)" -ge 9
check 'their starts are in the box of starts, within a twentieth' awk -F, 'FNR == 1 { next }
    FILENAME ~ /same/ && $1 == "0.000" {
        for (i = 2; i <= 3; i++) { if ($i < low[i]) low[i] = $i; if ($i > high[i]) high[i] = $i }
    }
    FILENAME ~ /next/ && $1 == "0" { for (i = 2; i <= 3; i++) { m = 0.05 * (high[i] - low[i]) + 1e-3
        bad += $i < low[i] - m || $i > high[i] + m } n++ }
    END { exit bad > 0 || n != 12 }' $dir/same.csv $dir/a1_next.csv
check 'the first one tells most' awk '/^next recordings/ { split($0, x, /tells |, the last one /)
    exit !(x[2] + 0 > x[3] + 0 && x[3] + 0 > 0) }' $dir/a1.log
check 'the trainer reads it' sh -c "$dir/two $dir/same.csv $dir/a1_next.csv torque=1 steps=1 out=$dir/r 2>&1 |
    grep '^24 recordings'"
$dir/two $dir/same.csv torque=1 held=0.2 steps=1 next=3 --resume out=$dir/a1 > $dir/b.log 2>&1
check 'later, with the weights of a training that has ended' test "$(recordings $dir/a1_next.csv)" -eq 3
check 'the weights stay' cmp $dir/a1.roln $dir/a2.roln
for last in 7 8 9 10 11 12; do # a look whose weights are the best so far
    $dir/two $dir/same.csv torque=1 held=0.2 steps=$last out=$dir/f > $dir/f.log 2>&1
    ! grep -q "^wrote .*step $last$" $dir/f.log || break
done
cp $dir/f.roln $dir/f.was
check 'the last look is the best one' grep -q "^wrote .*step $last$" $dir/f.log
$dir/two $dir/same.csv torque=1 held=0.2 steps=1 next=1 --resume out=$dir/f > $dir/g.log 2>&1
check 'the weights stay, of the last look, too' cmp $dir/f.roln $dir/f.was
check 'the older file stays' test "$(recordings $dir/a1_next.csv.old)" -eq 12
check 'without torques: their starts' sh -c "$dir/two $dir/same.csv held=0.2 steps=30 next=5 out=$dir/n > $dir/n.log 2>&1
    head -n 1 $dir/n_next.csv | grep '^t,q1,q2,qd1,qd2\$' && test \$(wc -l < $dir/n_next.csv) -eq 10"
check 'more than are tried' sh -c "$dir/two $dir/same.csv next=201 out=$dir/n 2>&1 | grep '^next=201: expected a'"

# the model of both, where nobody recorded
record $dir/a2_next.csv | sed 1d > $dir/chosen.csv
for more in more chosen; do
    { cat $dir/same.csv; echo; cat $dir/$more.csv; } > $dir/$more.all.csv
    $dir/two $dir/$more.all.csv test=$dir/test.csv torque=1 steps=150 out=$dir/$more > $dir/$more.log 2>&1
done
more=$(error $dir/more.log)
chosen=$(error $dir/chosen.log)
echo "figure: E_q after 250 ms anywhere: with 12 more of the same $more %, with 12 that were chosen $chosen %"
check 'chosen ones tell more' awk -v a="$more" -v b="$chosen" 'BEGIN { exit !(b > 0 && b < a / 2) }'

# one recording alone, cut into blocks
awk 'NR == 1 { print; next } /^$/ { exit } { print }' $dir/same.csv > $dir/one.csv
check 'one recording' sh -c "$dir/two $dir/one.csv torque=1 held=0.3 look=0.02 window=0 steps=20 next=2 out=$dir/o > $dir/o.log
    test -s $dir/o_next.csv"
check 'one recording without torques: starts at different places' sh -c "
    $dir/two $dir/one.csv held=0.3 look=0.02 window=0 steps=20 next=6 out=$dir/o > $dir/o.log
    test \$(sort -u $dir/o_next.csv | grep -c '^0,') -eq 6"
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
