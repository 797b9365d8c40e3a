#!/bin/sh
# From nothing to a model, as a user would: simulate the chain with MuJoCo, export CSV, train for about a minute with
# examples/train.c, and demand E_q(25 ms) below a bound on trajectories that it has not seen (POD leaves 34 %).
cd "$(dirname "$0")/../.." || exit 1
build/generate pend16 build/small.h5 --train 40 --test 5 --seed 1 --csv build/small || exit 1
gcc -std=c99 -D_POSIX_C_SOURCE=200809L -O3 -march=native -fno-math-errno -ffp-contract=off -I. -Iexamples -DMODEL=pend16 \
    examples/train.c -o build/train_small -lpthread -lm || exit 1
build/train_small build/small_train.csv test=build/small_test.csv ae=10000 acc=60000 ode=0 out=build/small > build/small.log
code=$?
cat build/small.log
rm -f build/small_train.csv build/small_test.csv build/small.h5
[ "$code" -eq 0 ] || exit 1
awk -v bound=2.0 '
    $1 == "build/small_test.csv" { on = 1 }
    on && $1 == 25 { e = $2 }
    END {
        ok = e ~ /^[0-9.]+$/ && e + 0 < bound
        printf "E_q(25 ms) %s %%, bound %s %%\n%d passed, %d failed\n", e, bound, ok, !ok
        exit !ok
    }' build/small.log
