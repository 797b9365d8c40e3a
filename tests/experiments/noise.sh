#!/bin/sh
# SPDX-License-Identifier: MIT
# How much sensor noise training bears: pend16, Gaussian noise on q of 1 % and 5 % of rms(q - mean), qd and qdd from the noisy
# q. Trains four models, 180 steps each, about a minute on two idle cores, and tests them on clean trajectories. A row whose log is
# there is not trained again. Run by `make noise`, from the top of the repository; logs in build/noise/.
set -e
dir=build/noise
mkdir -p $dir
gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples -DMODEL=pend16 examples/train.c \
    -o $dir/train -lpthread -lm
[ -f $dir/pend16_train.csv ] ||
    build/generate pend16 $dir/pend16.h5 --train 100 --test 10 --seed 1 --csv $dir/pend16 > $dir/generate.log
[ -f $dir/mild.csv ] || awk -F, -f tests/mujoco/mild.awk $dir/pend16_train.csv > $dir/mild.csv
printf '%-7s %-9s %8s %8s %8s %8s   E_q %% on clean test trajectories\n' noise smoothed '0 ms' '25 ms' '100 ms' '1 s'
for row in 0,0 0.01,0 0.01,15 0.05,25; do
    noise=${row%,*} smooth=${row#*,}
    log=$dir/$noise-$smooth.log
    grep -q '_test.csv$' "$log" 2> /dev/null || # done in an earlier call
        $dir/train $dir/mild.csv test=$dir/pend16_test.csv out=$dir/run noise="$noise" smooth="$smooth" steps=180 \
            > "$log" 2>&1 || true # a training may refuse
    awk -v noise="$noise" -v smooth="$smooth" '
        /_test.csv$/ { on = 1 } on && $1 == 0 { a = $2 } on && $1 == 25 { b = $2 }
        on && $1 == 100 { c = $2 } on && $1 == 1000 { d = $2 }
        { last = $0 }
        END { printf "%5.0f %%  %4d ms  ", 100 * noise, 2 * smooth
              if (on) printf "%8.2f %8.2f %8.2f %8.1f\n", a, b, c, d; else print last }' "$log"
done
