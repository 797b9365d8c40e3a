#!/bin/sh
# SPDX-License-Identifier: MIT
# learn.sh - from a MuJoCo model to a trained one: record, config, train, errors.
#
#   learn.sh MODEL.xml OUT BUDGET [key=value ..]     BUDGET of each training: seconds=300, say; key=value as of record
#   learn.sh table OUT ..                            a table of what was learned to OUT ..
#
# Needs build/record. Written: what record and examples/train.c write, beside OUT_full.* of a network on all joints where the
# config proposes fewer coordinates; OUT.learn, the table of errors: E_q in per cent of held-out recordings, of q + h qd, of the
# network on all joints, of the proposed model. Exit code, as of examples/train.c: 0, a model was trained; 3, there are weights, but
# no trained model: it ended before windows, or is no better than q + h qd at some horizon; 1, no weights. The last line says why.
top=$(dirname "$0")/../..

# errors FILE: E_q of the recordings that nobody trained with, as lines ms E_q failed windows
errors() {
    awk -F, '$1 ~ /_test[.]csv"$/ { printf "%g %s %d %d\n", $2, $3, $7, $8 }' "$1"
}

# what was learned as a row: | machine | joints, motors | n | 25 ms | 100 ms | 1 s | what there is to say |
row() {
    [ -f "$1.learn" ] || { echo "| $(basename "$1") | | | | | | $(tail -n 1 "$1.log" 2> /dev/null) |"; return; }
    awk -v name="$(basename "$1")" '
        /^joints/ { size = $2 ", " $4; n = $6 }
        function near(ms, t) { for (t in e) if ((t / ms - 1) ^ 2 < 0.1 ^ 2) return e[t] }
        /^ *[0-9]/ { e[$1] = $2 " / " $3 " / " $4 }
        /^note/ { sub(/^note /, ""); notes = notes (notes == "" ? "" : "; ") $0 }
        END { print "| " name " | " size " | " n " | " near(25) " | " near(100) " | " near(1000) " | " notes " |" }' "$1.learn"
}

if [ "$1" = table ]; then
    shift
    echo '| machine | joints, motors | n | 25 ms: q + h qd / all joints / learned | 100 ms | 1 s | |'
    echo '|---|---|---|---|---|---|---|'
    for out; do row "$out"; done
    exit
fi
[ $# -ge 3 ] || { sed -n '2,13s/^# \{0,1\}//p' "$0"; exit 1; }
model=$1 out=$2 budget=$3
shift 3
name=$(basename "$out")
mkdir -p "$(dirname "$out")"
rm -f "$out.learn"
"$top/build/record" "$model" "$out" "$@" > "$out.log" 2>&1
code=$?
cat "$out.log"
[ $code -eq 0 ] || exit 1
torque=$(head -n 1 "$out.csv" | awk '{ print /,(tau|u)1/ }')

# train NAME: with the default settings. Says why if there is nothing, or no trained model; ends with 0, 3 or 1
train() {
    ${CC:-cc} -std=c99 -O3 -march=native -fno-math-errno -ffp-contract=off -I"$(dirname "$out")" -I"$top" -I"$top/examples" \
        -DMODEL="$1" "$top/examples/train.c" -o "$out.train" -lpthread -lm > "$out.cc" 2>&1 || {
        echo "$1 does not compile: $(head -n 1 "$out.cc")"
        return 1
    }
    "$out.train" "$out.csv" test="${out}_test.csv" torque="$torque" "$budget" out="$(dirname "$out")/$1" \
        > "$(dirname "$out")/$1.log" 2>&1
    code=$?
    case $code in
    0) return ;;
    3) echo "$1: $(tail -n 1 "$(dirname "$out")/$1.log")" ;;
    *) echo "$1 was not trained: $(tail -n 1 "$(dirname "$out")/$1.log")" && code=1 ;;
    esac
    return $code
}
n=$(awk '/ROLN_AE/ { print $NF }' "$out.h")
N=$(awk '/ROLN_AE/ { sub(/,/, "", $3); print $3 }' "$out.h")
motors=$(sed -n 's/.*joints, \([0-9]*\) motors,.*/\1/p' "$out.h")
cp "$out.log" "$out.notes"
if [ "$n" != "$N" ]; then
    echo "training ${name}_full, all $N joints: ${out}_full.log"
    train "${name}_full" >> "$out.notes"
    [ $? -eq 1 ] || errors "${out}_full_errors.csv" > "$out.full"
fi
echo "training $name: $out.log"
why=$(train "$name")
code=$?
[ $code -ne 1 ] || { cat "$out.notes" > "$out.log"; echo "$why" | tee -a "$out.log"; exit 1; }
errors "${out}_errors.csv" > "$out.own"
[ -f "$out.full" ] || : > "$out.full"
{
    echo "joints $N motors $motors n $n"
    echo '   ms  q + h qd  all joints  learned'
    awk -v same="$([ "$n" = "$N" ] && echo 1)" -F'[ ,]' '
        function short(x) { return sprintf(x < 100 ? "%.2g" : "%.0f", x) }
        FILENAME ~ /_constant.csv$/ { if (FNR > 1) constant[$1] = short($2) }
        FILENAME ~ /[.]full$/ { full[$1] = short($2) }
        FILENAME ~ /[.]own$/ { if (same) full[$1] = short($2)
            printf "%5s %9s %11s %8s\n", $1, constant[$1], $1 in full ? full[$1] : "-", short($2) }' \
        "${out}_constant.csv" "$out.full" "$out.own"
    sed -n 's/^/note /; 2,$p' "$out.notes"
    awk '$3 > 0 && $1 > 900 && $1 < 1100 { print "note " $3 " of " $4 " roll-outs of 1 s failed" }' "$out.own"
    [ -z "$why" ] || echo "note $why"
} > "$out.learn"
rm -f "$out.train" "$out.cc" "$out.own" "$out.full" "$out.notes"
cat "$out.learn"
exit $code
