#!/bin/sh
# SPDX-License-Identifier: MIT
# real.sh - trains models of public recordings of real robots and prints a table of their errors: make real DATA=folder
#
#   real.sh FOLDER [SECONDS]     SECONDS of each training, 300 by default
#
# FOLDER holds double_pendulum/ and ur10e/, or one of them, or them as .tar.gz: docs/training.md, "Real recordings", says where they
# come from. Nothing in them is changed. Logs and weights are left in build/real. Errors of torques and E_q, in per cent, are those
# of the model, of the regression that its networks begin with, and of q + h qd. Exit code: 0, both sets were
# accepted; 1, one was not, or there is none.
[ -d "$1" ] || { sed -n '3,9s/^# \{0,1\}//p' "$0"; exit 1; }
data=$(cd "$1" && pwd)
seconds=${2:-300}
cd "$(dirname "$0")/../.." || exit 1
dir=build/real
mkdir -p $dir
code=0
sets=0

# config NAME JOINTS
config() {
    cat > $dir/"$1".h << END_OF_FILE
#define ROLN_NAME     $1
#define ROLN_AE       $2
#define ROLN_MLP      16, 16
#define ROLN_ANGLES   $(yes 1, | head -n $2 | tr -d '\n' | sed 's/,$//')
#define ROLN_DAMPING  1
#define ROLN_FRICTION 1
#define ROLN_HORIZON  25
#include "roln.h"
END_OF_FILE
}

# learn NAME JOINTS SETTING ..: trains with the recordings of FOLDER/NAME, and prints a row of the table
learn() {
    name=$1
    config "$name" "$2"
    shift 2
    from=$data/$name
    if [ ! -d "$from" ] && [ -f "$from.tar.gz" ]; then
        tar xzf "$from.tar.gz" -C $dir || exit 1
        from=$dir/$name
    fi
    [ -d "$from" ] || { echo "$name is not in $data" >&2; return; }
    sets=$((sets + 1))
    ${CC:-cc} -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I$dir -I. -Iexamples -DMODEL="$name" examples/train.c \
        -o $dir/"$name".train -lpthread -lm || exit 1
    rm -f $dir/"$name"_errors.csv
    echo "./$name $from $* torque=1 seconds=$seconds out=$dir/$name" > $dir/"$name".log
    $dir/"$name".train "$from" "$@" torque=1 seconds="$seconds" out=$dir/"$name" >> $dir/"$name".log 2>&1
    ended=$?
    [ -s $dir/"$name"_errors.csv ] || { echo "$name: $(tail -n 2 $dir/"$name".log | head -n 1)" >&2; code=1; return; }
    awk -F, -v name="$name" -v ended=$ended '
        NR == FNR {
            words = split($0, x, " ")
            if (/^time: .* resampled to/) { sub(/.*resampled to /, ""); sub(/ by local.*/, ""); rate = $0 }
            if (/^filter: /) filter = x[2] " Hz"
            if (/ recordings [(]/) { count = x[1]; held = substr(x[3], 2) }
            if (/^regression on the same/) {
                for (k = 1; k < words; k++) {
                    if (x[k] == "off") by_tau = x[k + 2]
                    if (x[k] == "E_q") by[x[k + 4]] = x[k + 1]
                }
            }
            if (/tau_model - tau, rms/) on = 1
            else if (/^M at/) on = 0
            else if (on) { tau += x[2] ^ 2; off += x[3] ^ 2 }
            next
        }
        /^recordings,/ { for (i = 1; i <= NF; i++) behind[$i] = NF - i } # columns from the end: names may hold commas
        function of(name) { return $(NF - behind[name]) }
        /^"held-out/ { e[of("ms")] = of("E_q_percent"); constant[of("ms")] = of("constant_velocity_percent") }
        function near(ms, x, t) { for (t in x) if ((t / ms - 1) ^ 2 < 0.1 ^ 2) return x[t] }
        function row(ms) { return sprintf("%.3g / %.3g / %.3g", near(ms, e), near(ms, by), near(ms, constant)) }
        END {
            printf "| %s | %s, %s | %s | %s | %.3g / %.3g | %s | %s | %d |\n", name, count, held, rate, filter,
                   100 * sqrt(off / tau), by_tau, row(100), row(1000), ended
        }' $dir/"$name".log $dir/"$name"_errors.csv
}

cat << 'end'
E_q, torques: of the model / of the regression [/ of q + h qd], in per cent

| set | recordings, held out | rate | filter | torques | E_q 100 ms | 1 s | exit code |
|---|---|---|---|---|---|---|---|
end
learn double_pendulum 2 'q=pos_meas*,rad' 'qd=vel_meas*,rad/s' 'tau=tau_meas*,Nm' 'held=*143601*,*144003*'
learn ur10e 6 t=1 q=2:7,rad qd=8:13,rad/s 'tau=14:19,A*14.87,13.26,11.13,10.62,11.03,11.47' \
    'held=*20_02_05-20sec_8harm*,*20_02_19_15harm50sec*'
[ $sets -gt 0 ] && [ $code -eq 0 ]
