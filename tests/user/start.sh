#!/bin/sh
# SPDX-License-Identifier: MIT
# start=regression: networks that begin at the regression compute its torques. A double pendulum, two rods of 1 kg and 0.5 m with a
# point mass at their ends, friction 0.3 Nms/rad, on motion that its joints are given: recorded without noise and with 5 %.
cd "$(dirname "$0")/../.." || exit 1
dir=build/start
. tests/user/check.sh

cat > $dir/two.h << 'END_OF_FILE'
#define ROLN_NAME     two
#define ROLN_AE       2
#define ROLN_MLP      16, 16
#define ROLN_ANGLES   1, 1
#define ROLN_DAMPING  1
#define ROLN_FRICTION 1
#define ROLN_HORIZON  5
#include "roln.h"
END_OF_FILE
gcc -std=c99 -O2 -march=native -fno-math-errno -ffp-contract=off -I. -I$dir -Iexamples -DMODEL=two examples/train.c -o $dir/two \
    -lpthread -lm

# record NOISE, over the rms torque. A torque acts from its sample to the next: it is that of the middle
record() {
    awk -v noise="$1" '
    function move(k, t, j, n, w, p, A) {
        for (j = 1; j <= 2; j++) {
            q[j] = v[j] = a[j] = 0
            for (n = 1; n <= 3; n++) {
                w = 1 + 0.7 * n + 0.13 * k + 0.4 * j * n; p = 2.1 * k * n + 1.3 * j + n * n; A = 0.8 / n
                q[j] += A * sin(w * t + p); v[j] += A * w * cos(w * t + p); a[j] -= A * w * w * sin(w * t + p)
            }
        }
    }
    BEGIN {
        for (k = 0; k < 10; k++) {
            for (i = 0; i < 1000; i++) {
                t = 0.002 * i
                move(k, t); x1 = q[1]; x2 = q[2]; v1 = v[1]; v2 = v[2]
                move(k, t + 0.001)
                c = 0.25 * cos(q[2]); s = 0.25 * sin(q[2])
                tau1 = (0.75 + 2 * c) * a[1] + (0.25 + c) * a[2] - s * (2 * v[1] * v[2] + v[2] ^ 2) \
                    + 9.81 * (sin(q[1]) + 0.5 * sin(q[1] + q[2])) + 0.3 * v[1]
                tau2 = (0.25 + c) * a[1] + 0.25 * a[2] + s * v[1] ^ 2 + 4.905 * sin(q[1] + q[2]) + 0.3 * v[2]
                tau1 += noise * 8 * (sin(171 * t + 5 * k * k) + sin(263 * t + k * k))
                tau2 += noise * 3 * (sin(191 * t + 7 * k * k) + sin(239 * t + 3 * k * k))
                printf "%.9g,%.9g,%.9g,%.9g,%.9g,%.9g,%.9g\n", t, x1, x2, v1, v2, tau1, tau2
            }
            print ""
        }
    }'
}

# "torques .. off by X %" of the regression and, at step 0, of the networks, on held-out recordings: the latter over the former
ratio() {
    awk '/ E_q\(/ && $1 == 0 { for (i = 1; i < NF; i++) if ($i == "torques") of_networks = $(i + 1) }
        /^regression on the same/ { of_regression = $9 } END { print of_networks / of_regression }' "$1"
}

record 0 > $dir/clean.csv
$dir/two $dir/clean.csv torque=1 start=regression held=0.2 steps=1 window=0 out=$dir/clean > $dir/clean.log 2>&1
grep '^torques of the networks' $dir/clean.log
check 'without noise: off from the regression by less than 0.1 %' \
    awk '/^torques of the networks are off by/ { ok = $8 < 0.1 } END { exit !ok }' $dir/clean.log
check 'without noise: off from held-out torques by less than 0.15 %' \
    awk '/ E_q\(/ && $1 == 0 { for (i = 1; i < NF; i++) if ($i == "torques") ok = $(i + 1) < 0.15 } END { exit !ok }' $dir/clean.log
# polynomials, M of squares and of Cholesky, begin there in closed form
for mass in "squares, 3" cholesky; do
    sed "s/two$/poly/; s/ROLN_MLP .*/ROLN_POLYNOMIALS 3, 2/; /ROLN_AE/a #define ROLN_MASS $mass" $dir/two.h > $dir/poly.h
    gcc -std=c99 -O2 -march=native -fno-math-errno -ffp-contract=off -I. -I$dir -Iexamples -DMODEL=poly examples/train.c \
        -o $dir/poly -lpthread -lm
    $dir/poly $dir/clean.csv torque=1 start=regression held=0.2 steps=1 window=0 out=$dir/poly > $dir/poly.log 2>&1
    grep '^torques of the networks' $dir/poly.log
    check "polynomials, $mass: off from the regression by less than 0.1 %" \
        awk '/^torques of the networks are off by/ { ok = $8 < 0.1 } END { exit !ok }' $dir/poly.log
done
record 0.05 > $dir/noisy.csv
$dir/two $dir/noisy.csv torque=1 start=regression held=0.2 steps=1 window=0 out=$dir/noisy > $dir/noisy.log 2>&1
grep '^torques of the networks' $dir/noisy.log
echo "networks over regression: $(ratio $dir/noisy.log)"
check 'with noise: at most 1.2 times as far off as the regression' \
    awk -v x="$(ratio $dir/noisy.log)" 'BEGIN { exit !(x > 0 && x < 1.2) }'
check 'with noise: few steps' awk '/^torques of the networks/ { ok = $16 <= 10 } END { exit !ok }' $dir/noisy.log

rm -rf $dir
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
