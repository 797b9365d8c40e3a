#!/bin/sh
# SPDX-License-Identifier: MIT
# train.sh - which config is the one for these recordings? Trains each of several, a chart and layers, say, or charts of two
# degrees, and compares how they predict the held-out recordings.
#
#   sh examples/train.sh motion.csv pend16 pend16_layers [key=value ...]
#
# Configs NAME.h lie here or in examples; key=value as for train.c. Each leaves NAME.log and what train.c writes. The best is named
# first.
[ $# -ge 2 ] || { sed -n '3,9s/^# \{0,1\}//p' "$0"; exit 1; }
top=$(dirname "$0")/..
motion=$1
shift
models=
keys=
failed=0
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
    "./$m.train" "$motion" out="$m" $keys > "$m.log" 2>&1 || { failed=1; tail -n 1 "$m.log"; }
    rm "$m.train"
done
for m in $models; do
    awk -v m="$m" '/typical E_q of/ { print $(NF - 4), m ": " $0 }' "$m.log"
done | sort -g | cut -d ' ' -f 2-
exit $failed
