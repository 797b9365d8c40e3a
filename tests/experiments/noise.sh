#!/bin/sh
# How much sensor noise training bears: pend16, Gaussian noise on q of 1 % and 5 % of rms(q - mean), qd and qdd from the noisy
# q. Trains eleven models and tests them on clean trajectories; about 40 minutes on two cores. A row whose log is there is not
# trained again. Run by `make noise`, from the top of the repository; logs in build/noise/.
set -e
dir=build/noise
mkdir -p $dir
gcc -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples -DMODEL=pend16 examples/train.c \
    -o $dir/train -lpthread -lm
[ -f $dir/pend16_train.csv ] ||
    build/generate pend16 $dir/pend16.h5 --train 100 --test 10 --seed 1 --csv $dir/pend16 > $dir/generate.log
[ -f $dir/mild.csv ] || awk -F, -f tests/mujoco/mild.awk $dir/pend16_train.csv > $dir/mild.csv
printf '%-7s %-9s %-34s %8s %8s %8s %8s   E_q %% on clean test trajectories\n' noise smoothed loss '0 ms' '25 ms' '100 ms' '1 s'
row() {
    name=$1 noise=$2 smooth=$3
    shift 3
    log=$dir/$(echo "$name-$noise-$smooth" | tr ' ,' '__').log
    grep -q '^ 2000' "$log" 2> /dev/null || # done in an earlier call
    $dir/train $dir/mild.csv test=$dir/pend16_test.csv out=$dir/run noise="$noise" smooth="$smooth" held=0.1 ae=8000 look=0.25 \
        lr_joint=0.05 "$@" > "$log" 2>&1 || true # a training may refuse
    awk -v name="$name" -v noise="$noise" -v smooth="$smooth" '
        /_test.csv$/ { on = 1 } on && $1 == 0 { a = $2 } on && $1 == 25 { b = $2 }
        on && $1 == 100 { c = $2 } on && $1 == 1000 { d = $2 }
        { last = $0 }
        END { printf "%5.0f %%  %4d ms   %-34s ", 100 * noise, 2 * smooth, name
              if (on) printf "%8.2f %8.2f %8.2f %8.1f\n", a, b, c, d; else print last }' "$log"
}
acc="acc=40000 ode=0"
ode="acc=30000 ode=1500 scaled=1 w_pos=1"
var="acc=0 ode=5000 positions=1 scaled=1 ode_lr=0.3"
fine="acc=30000 ode=1500 positions=1 scaled=1 ode_lr=0.1"
row 'acceleration' 0 0 $acc
row 'acceleration' 0.01 0 $acc
for n in 0.01,15 0.05,25; do
    row 'acceleration' ${n%,*} ${n#*,} $acc
    row 'acceleration, then ODE' ${n%,*} ${n#*,} $ode
    row 'acceleration, then variational' ${n%,*} ${n#*,} $fine
done
row 'variational (positions only)' 0 0 $var
row 'variational (positions only)' 0.01 15 $var
row 'variational (positions only)' 0.05 25 $var
