#!/bin/sh
# SPDX-License-Identifier: MIT
# train.sh - which config is the one for these recordings? Trains each of several, a chart and layers, say, or charts of two
# degrees, and compares how they predict the held-out recordings.
#
#   sh examples/train.sh motion.csv pend16 pend16_layers [key=value ...]
#
# Configs NAME.h lie here or in examples; key=value as for train.c. Each leaves NAME.log and what train.c writes. The best trained
# model is named first; behind it come those that train.c does not call trained (its exit code 3), with the reason.
#
# Exit code: 0, all are trained; 3, all have weights, but not all are trained; 1, one has none.
[ $# -ge 2 ] || { sed -n '3,11s/^# \{0,1\}//p' "$0"; exit 1; }
top=$(dirname "$0")/..
motion=$1
shift
models=
keys=
code=0
for word; do
    case $word in
    out=*) echo "out= is that of each config"; exit 1 ;;
    *=*) keys="$keys $word" ;;
    *) models="$models $word" ;;
    esac
done
for m in $models; do
    ${CC:-cc} -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I. -I"$top" -I"$top/examples" -DMODEL="$m" \
        "$top/examples/train.c" -o "$m.train" -lpthread -lm || exit 1
    echo "$m: see $m.log"
    "./$m.train" "$motion" out="$m" $keys > "$m.log" 2>&1
    ended=$?
    [ $ended -eq 0 ] || echo "$m: $(tail -n 1 "$m.log")"
    case $ended in 0) ;; 3) [ $code -eq 0 ] && code=3 ;; *) code=1 ;; esac
    rm "$m.train"
done
for m in $models; do
    awk -v m="$m" '/typical E_q of/ { e = $(NF - 4); text = $0 } /^no trained model/ { bad = 1 }
        END { if (text != "") print bad + 0, e, m ": " text (bad ? " (no trained model)" : "") }' "$m.log"
done | sort -k 1,1n -k 2,2g | cut -d ' ' -f 3-
exit $code
