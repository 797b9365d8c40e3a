#!/bin/sh
# SPDX-License-Identifier: MIT
# smoother.sh - smoother=FILE: a model that was trained on coarse encoders finds q and qd of its own recordings, and a second
# training on them is better. A pendulum with a motor and friction behind encoders of 10 bits, sampled at 1 kHz; and one under a
# base that is driven.
cd "$(dirname "$0")/../.." || exit 1
dir=build/smoother
. tests/user/check.sh

printf '#define ROLN_NAME motor\n#define ROLN_AE 1\n#define ROLN_MLP 8\n#define ROLN_ANGLES 1\n#define ROLN_DAMPING 1
#define ROLN_HORIZON 25\n#include "roln.h"\n' > $dir/motor.h
sed 's/motor$/other/; s/MLP 8/MLP 4/' $dir/motor.h > $dir/other.h
sed 's/motor$/moved/; s/AE 1/AE 2/; s/ANGLES 1/ANGLES 1, 0/; /#include/i #define ROLN_DRIVEN 1' $dir/motor.h > $dir/moved.h
for m in motor other moved; do
    gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -I$dir -Iexamples -DMODEL=$m examples/train.c -o $dir/$m \
        -lpthread -lm || exit 1
done
# record STEPS of a turn, 0: no encoder. qdd = u - 9.81 sin q - 0.1 qd
record() {
    awk -v steps="$1" 'BEGIN {
        turn = 8 * atan2(1, 1)
        for (k = 0; k < 10; k++) {
            a = 1.2 * sin(k); c = cos(2 * k)
            for (i = 0; i < 2000; i++) {
                u = 4 * sin(0.0026 * i * (1 + k % 3) + k) + 2 * sin(0.0082 * i + 3 * k)
                n = a * steps / turn
                y = steps ? (n > 0 ? int(n + 0.5) : -int(0.5 - n)) * turn / steps : a
                if (steps) printf "%.3f,%.9g,%.9g\n", 0.001 * i, y, u
                else printf "%.3f,%.9g,%.9g,%.9g\n", 0.001 * i, a, c, u
                for (j = 0; j < 10; j++) { c += 0.0001 * (u - 9.81 * sin(a) - 0.1 * c); a += 0.0001 * c }
            }
            print ""
        } }'
}
record 1024 > $dir/coarse.csv
record 0 > $dir/true.csv
sed -i '1i t,q1,tau1' $dir/coarse.csv
# error LOG: E_q after 1 s of the recordings without encoders, of the model
error() { awk '/true.csv$/ { on = 1 } on && $1 == 1000 { print $2; exit }' "$1"; }
regression() { awk '/^regression on the same/ { print $9 }' "$1"; }

$dir/motor $dir/coarse.csv test=$dir/true.csv torque=1 held=0.2 steps=20 out=$dir/first > $dir/first.log 2>&1
check "a first training: ended with $?" test $? -eq 0
$dir/motor $dir/coarse.csv test=$dir/true.csv torque=1 held=0.2 steps=20 smoother=$dir/first.roln out=$dir/motor \
    > $dir/second.log 2>&1
check "a second one: ended with $?" test $? -eq 0
grep 'Kalman smoother' $dir/second.log
echo "E_q after 1 s of the true motion: $(error $dir/first.log) %, $(error $dir/second.log) %"
echo "torques of the regression: $(regression $dir/first.log) %, $(regression $dir/second.log) %"
check 'q moves by its noise' awk '/a Kalman smoother moves q by/ { sub(/.*moves q by /, "")
        ok = $1 > 0.7 * $3 && $1 < 1.15 * $3 && $3 + 0 > 0.0015 && $3 + 0 < 0.0021 } END { exit !ok }' $dir/second.log
check 'the second model is as good' \
    awk -v a="$(error $dir/first.log)" -v b="$(error $dir/second.log)" 'BEGIN { exit !(b > 0 && b < 1.1 * a) }'
check 'the regression on its motion is ten times as good' \
    awk -v a="$(regression $dir/first.log)" -v b="$(regression $dir/second.log)" \
    'BEGIN { exit !(b > 0 && b < a / 10) }'
check 'noise of the filter is that of the encoder' awk '/noise_q\[/ { getline; gsub(/[^0-9.e-]/, " "); split($0, x, " ")
        exit !(x[1] > 0.0013 && x[1] < 0.0025) }' $dir/motor_limits.h

# a model that knows nothing moves q by no more than noise explains
$dir/motor $dir/coarse.csv torque=1 held=0.2 steps=1 start=random out=$dir/poor > /dev/null 2>&1
$dir/motor $dir/coarse.csv torque=1 held=0.2 steps=20 smoother=$dir/poor.roln out=$dir/again > $dir/poor.log 2>&1
check 'a poor model: q moves by its noise' awk '/a Kalman smoother moves q by/ { sub(/.*moves q by /, "")
        ok = $1 + 0 > 0 && $1 < 1.15 * $3 } END { exit !ok }' $dir/poor.log

# a pendulum under a base that is driven: encoders alone. qdd = -9.81 sin q - a cos q - 0.1 qd, a: the acceleration of the base
drive() {
    awk -v steps="$1" 'function reads(x) { return steps ? (int(x * steps / turn + 1000.5) - 1000) * turn / steps : x }
    function base(t) { return 0.4 * sin(2.1 * t + k) + 0.15 * sin(5.3 * t + 2 * k) }
    function base_dd(t) { return -0.4 * 2.1 * 2.1 * sin(2.1 * t + k) - 0.15 * 5.3 * 5.3 * sin(5.3 * t + 2 * k) }
    BEGIN {
        turn = 8 * atan2(1, 1)
        for (k = 0; k < 10; k++) {
            a = 1.2 * sin(k); c = cos(2 * k)
            for (i = 0; i < 2000; i++) {
                t = 0.001 * i
                printf "%.3f,%.9g,%.9g\n", t, reads(a), reads(base(t))
                for (j = 0; j < 10; j++) {
                    c += 0.0001 * (-9.81 * sin(a) - base_dd(t + 0.0001 * j) * cos(a) - 0.1 * c); a += 0.0001 * c
                }
            }
            print ""
        } }'
}
drive 1024 > $dir/coarse.csv
drive 0 > $dir/true.csv
sed -i '1i t,q1,q2' $dir/coarse.csv
$dir/moved $dir/coarse.csv test=$dir/true.csv held=0.2 steps=150 out=$dir/first > $dir/first.log 2>&1
check "driven: a first training ended with $?" test $? -eq 0
$dir/moved $dir/coarse.csv test=$dir/true.csv held=0.2 steps=150 smoother=$dir/first.roln out=$dir/moved > $dir/second.log 2>&1
check "driven: a second one ended with $?" test $? -eq 0
grep 'Kalman smoother' $dir/second.log
echo "E_q after 1 s of the true motion: $(error $dir/first.log) %, $(error $dir/second.log) %"
check 'driven: the second model is better' \
    awk -v a="$(error $dir/first.log)" -v b="$(error $dir/second.log)" 'BEGIN { exit !(b > 0 && b < 0.7 * a) }'

# says PATTERN COMMAND ..: it ends with 1 and says so
says() {
    pattern=$1
    shift
    "$@" > $dir/says.log 2>&1
    [ $? -eq 1 ] && grep "$pattern" $dir/says.log
}
check 'no file' says '^smoother=none.roln: cannot be opened' $dir/motor $dir/coarse.csv torque=1 smoother=none.roln
check 'another config' says 'no weights of this config' $dir/other $dir/coarse.csv torque=1 smoother=$dir/first.roln
head -c 100 $dir/first.roln > $dir/cut.roln
check 'cut off' says 'no weights of this config' $dir/motor $dir/coarse.csv torque=1 smoother=$dir/cut.roln

rm -rf $dir
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
