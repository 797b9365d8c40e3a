# SPDX-License-Identifier: MIT
# trainings.sh - what train.sh and endings.sh share: how a program ends, small recordings of simulated chains and
# the trainers of three configs for them. Sourced with $dir, which it empties, at the root of the repository.
. tests/user/check.sh
# below FILE HORIZON BOUND LOG: E_q in the table of FILE
below() {
    awk -v file="$1" -v ms="$2" -v bound="$3" '/[.]csv$/ { on = $1 == file } on && $1 == ms { e = $2 }
        END { print "E_q(" ms " ms) " e " %, bound " bound " %"; exit !(e ~ /^[0-9.]+$/ && e + 0 < bound) }' "$4"
}
# says WORDS COMMAND ..: it ends with 1, and says them
says() { ends 1 "$@"; }
# short COMMAND ..: a training that is short on purpose, so it writes weights and ends with 3
short() { ends 3 '^no trained model: ' "$@"; }
# ends CODE WORDS COMMAND ..
ends() {
    code=$1 said=$2
    shift 2
    "$@" > $dir/says.log 2>&1
    [ $? -eq "$code" ] && grep "$said" $dir/says.log || { tail -n 2 $dir/says.log; false; }
}
# left NAME STEPS: weights of it are there, and their header says what they are
left() { test -s $dir/$1.roln && head -n 1 $dir/$1_weights.h | grep "^/[*] train.c: $2"; }
# looks NAME COUNT: waits until so many stand in its log
looks() { until [ "$(grep -c E_q $dir/$1.log 2> /dev/null)" -ge "$2" ]; do sleep 0.05; done; }
# wall SECONDS COMMAND ..: it takes no longer, but for 10 % and what a loaded machine takes to start and stop a program
wall() {
    most=$1 from=$(date +%s%N)
    shift
    "$@" || return 1
    awk -v ns=$(($(date +%s%N) - from)) -v most="$most" 'BEGIN { print ns / 1e9 " s"; exit !(ns / 1e9 < 1.1 * most + 0.5) }'
}
# stops COMMAND ..: it is ended by seconds=, and has a model or not, as fast as the machine is
stops() { "$@" > $dir/says.log 2>&1; code=$?; { [ $code -eq 0 ] || [ $code -eq 3 ]; } && grep '^ended by seconds=' $dir/says.log; }
early=$dir/early
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
# 6 recordings of half a second
awk 'NR == 1; /^$/ { i = 0; if (++k < 6) print; next } NR > 1 && k < 6 && i++ < 500' $dir/2_train.csv > $dir/small.csv
