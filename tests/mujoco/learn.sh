#!/bin/sh
# SPDX-License-Identifier: MIT
# learn.sh - from a MuJoCo model to a trained one: record, config, train, errors, verdict.
#
#   learn.sh MODEL.xml OUT BUDGET [key=value ..]     BUDGET: seconds=300 of all, or steps=300 of each training; key=value: record
#   learn.sh .. next=K                               a model of the first recordings chooses K more, in a quarter of the budget;
#                                                    none for machines with equalities or strings, whose starts would break them
#   learn.sh table OUT ..                            a table of what was learned to OUT ..
#   OPTIMISE=-O1 learn.sh ..                         the trainer is compiled sooner, and slower
#
# Needs build/record. Written: what record and examples/train.c write, beside OUT_full.* of a network on all joints where the
# config proposes fewer coordinates; OUT.learn, the table of errors: E_q in per cent of held-out recordings, of q + h qd, of the
# network on all joints, of the model, and E_qd of the model; then notes and the verdict.
# Trainings: networks begin with 16, 16, and that on all joints has a quarter of the budget. If more hinges may be angles, both
# configs train for 15 % of the time, and the better one goes on. If the network on all joints has less than half of the error, it
# goes on in place of fewer coordinates, and is OUT.*.
# Polynomials follow, if there are at most three coordinates, or four without angles; with seconds= in half of what is left. With
# seconds= networks of 32, 32 follow if there is time for them, else what won goes on. Polynomials and networks of 32, 32 replace
# those of 16, 16 if they are 10 % better.
# Exit code: 0, the verdict is "useful for control" or "useful for prediction up to .. s"; 3, "not useful", there are weights;
# 1, no weights. The last line says why. The rules of the verdict: docs/training.md, "Any MJCF".
top=$(dirname "$0")/../..
optimise=${OPTIMISE:--O3 -march=native}

# errors FILE: of recordings that nobody trained with, as lines: ms E_q failed windows E_qd q+h.qd counts
errors() {
    awk -F, '/^recordings,/ { for (i = 1; i <= NF; i++) behind[$i] = NF - i } # columns from the end: names may hold commas
        function of(name) { return $(NF - behind[name]) }
        /_test[.]csv",/ { printf "%g %s %d %d %s %s %d\n", of("ms"), of("E_q_percent"), of("failed"), of("windows"),
            of("E_qd_percent"), of("constant_velocity_percent"), of("counts") }' "$1"
}

# what was learned as a row: | machine | joints, motors | n | 25 ms | 100 ms | 1 s | verdict | what there is to say |
row() {
    [ -f "$1.learn" ] || { echo "| $(basename "$1") | | | | | | | $(tail -n 1 "$1.log" 2> /dev/null) |"; return; }
    awk -v name="$(basename "$1")" '
        /^joints/ { size = $2 ", " $4; n = $6 }
        function near(ms, t) { for (t in e) if ((t / ms - 1) ^ 2 < 0.1 ^ 2) return e[t] }
        /^ *[0-9]/ { e[$1] = $2 " / " $3 " / " $4 }
        /^note/ { sub(/^note /, ""); notes = notes (notes == "" ? "" : "; ") $0 }
        /^(not )?useful/ { verdict = $0 }
        END { print "| " name " | " size " | " n " | " near(25) " | " near(100) " | " near(1000) " | " verdict " | " notes " |" }' \
        "$1.learn"
}

if [ "$1" = table ]; then
    shift
    echo '| machine | joints, motors | n | 25 ms: q + h qd / all joints / learned | 100 ms | 1 s | verdict | |'
    echo '|---|---|---|---|---|---|---|---|'
    for out; do row "$out"; done
    exit
fi
[ $# -ge 3 ] || { sed -n '2,21s/^# \{0,1\}//p' "$0"; exit 1; }
began=$(date +%s)
model=$1 budget=$3 next=
out=$("$top/build/record" --name "$2") || exit 1
[ "$out" = "$2" ] || echo "$2 is written as $out, since configs are named after it"
shift 3
for word; do # next=K is not for the recorder
    shift
    case $word in next=*) next=${word#next=} ;; *) set -- "$@" "$word" ;; esac
done
name=$(basename "$out")
try=$out.try
{ rm -rf "$try" && mkdir -p "$try"; } || exit 1
rm -f "$out.learn"

# seconds that are left of the budget: part $1 of 100 of them, but part $2 of 100 of the whole at least; steps= has no such end
left() {
    echo $((${budget#seconds=} + began - $(date +%s))) | awk -v part="$1" -v least="${2:-2}" -v all="${budget#seconds=}" \
        '{ x = $1 * part / 100; y = all * least / 100; x = x > y ? x : y; print (x > 5 ? int(x) : 5) }'
}
timed() { [ "$budget" != "${budget#seconds=}" ]; }
part_of_budget() { if timed; then echo "seconds=$(left "$1" "${2:-2}")"; else echo "$budget"; fi; }
quarter_of_budget() { if timed; then part_of_budget 25; else echo "steps=$(((${budget#steps=} + 3) / 4))"; fi; }

# logged LOG COMMAND ..: its output goes to LOG, and behind that of others to LOG.all, and lines that show progress to the terminal;
# returns its exit code
logged() {
    log=$1
    shift
    { "$@" 2>&1; echo $? > "$try/code"; } | awk -v log_file="$log" '{ print > log_file; print >> (log_file ".all"); fflush() }
        /^  recording|^  steps of|^ +[0-9]+  E_q|^chart: step/ { print substr($0, 1, 110); fflush() }'
    return "$(cat "$try/code")"
}

# the recordings, and what the trainer has to know of them
record_all() {
    logged "$try/record.log" "$top/build/record" "$model" "$out" "$@"
    code=$?
    grep -v '^  recording\|^  steps of' "$try/record.log" > "$out.log"
    cat "$out.log"
    [ $code -eq 0 ] || return 1
    torque=$(head -n 1 "$out.csv" | awk '{ print /,(tau|u)1/ }')
    sliders=$(sed -n 's/^   sliders: \([0-9,]*\).*/sliders=\1/p' "$out.h")
}
record_all "$@" || exit 1

# train PLACE NAME SETTING ..: the config NAME of folder PLACE, which also gets all files. Returns 0, 3 or 1, as the trainer
train() {
    place=$1
    config=$2
    shift 2
    # shellcheck disable=SC2086 # words
    [ -x "$place/train" ] ||
        ${CC:-cc} -std=c99 $optimise -fno-math-errno -ffp-contract=off -I"$place" -I"$top" -I"$top/examples" \
            -DMODEL="$config" "$top/examples/train.c" -o "$place/train" -lpthread -lm > "$place/cc" 2>&1 || {
        echo "$config does not compile: $(head -n 1 "$place/cc")" > "$place/log"
        return 1
    }
    logged "$place/log" "$place/train" "$out.csv" torque="$torque" out="$place/$config" $sliders "$@"
    code=$?
    [ $code -eq 0 ] || [ $code -eq 3 ] || {
        sed -i "\$s/^/$config was not trained: /" "$place/log"
        return 1
    }
    return $code
}

# a folder of its own for each config: place FOLDER HEADER [NAME [OPTIONS]], the options in place of ROLN_MLP
place() {
    rm -rf "${try:?}/$1"
    mkdir -p "$try/$1"
    sed "s/^#define ROLN_MLP .*/#define ROLN_${4:-MLP 16, 16}/" "$2" > "$try/$1/${3:-$name}.h"
}

# the best typical E_q of the looks of a config up to step $2, of all without it
typical() {
    awk -v most="${2:-1e9}" '/^ +[0-9]+  E_q/ && $1 <= most { x = $0; sub(/.*typical /, "", x); sub(/ %.*/, "", x)
        if (best == "" || x + 0 < best + 0) best = x } END { print best }' "$try/$1/log.all"
}
# better A B PART: the error of A is less than that part of that of B; with a fourth argument up to the last step of both
better() {
    most=$([ $# -lt 4 ] || { steps_of "$1"; steps_of "$2"; } | sort -n | head -n 1)
    awk -v a="$(typical "$1" "$most")" -v b="$(typical "$2" "$most")" -v part="$3" \
        'BEGIN { exit !(a != "" && (b == "" || a + 0 < part * b)) }'
}
steps_of() { awk '/^ +[0-9]+  E_q/ { n = $1 } END { print n + 0 }' "$try/$1/log"; }
by_itself() { ! grep -q '^ended by\|^no trained model: ended by s' "$try/$1/log"; }

if [ "${next:-0}" != 0 ]; then
    echo "training $name, to choose $next recordings more"
    place first "$out.h"
    train "$try/first" "$name" next="$next" "$(quarter_of_budget)"
    [ -s "$try/first/${name}_next.csv" ] || { tail -n 1 "$try/first/log"; exit 1; }
    record_all "$@" next="$try/first/${name}_next.csv" || record_all "$@" || exit 1
fi
n=$(awk '/ROLN_AE/ { print $NF }' "$out.h")
N=$(awk '/ROLN_AE/ { sub(/,/, "", $3); print $3 }' "$out.h")
motors=$(sed -n 's/.*joints, \([0-9]*\) motors,.*/\1/p' "$out.h" | head -n 1)
grep -v '^  ' "$out.log" > "$out.notes"
: > "$out.full"
if [ "$n" != "$N" ]; then
    echo "training ${name}_full, all $N joints: ${out}_full.log"
    place full "${out}_full.h" "${name}_full"
    began_training=$(date +%s)
    train "$try/full" "${name}_full" test="${out}_test.csv" "$(quarter_of_budget)"
    if [ $? -eq 1 ]; then tail -n 1 "$try/full/log" >> "$out.notes"; else
        errors "$try/full/${name}_full_errors.csv" > "$out.full"
        cp "$try/full/${name}_full"* "$(dirname "$out")"
    fi
    cp "$try/full/log" "${out}_full.log"
    spent_full=$(($(date +%s) - began_training))
fi
place small "$out.h"
won=small
if [ -f "${out}_angles.h" ]; then
    place angles "${out}_angles.h"
    order='small angles'
    [ "$N" -lt 3 ] || order='angles small' # the gravity and inertia of arms are sums of sines and cosines
    won=${order% *}
    text=
    for c in $order; do
        if timed && [ "$c" != "$won" ] && [ "$(left 100)" -lt "$(left 0 50)" ]; then
            text="no time to compare joints as numbers with all hinges as angles: $won"
            break
        fi
        [ $c = small ] && echo "training $name, joints as numbers" || echo "training $name, all hinges as angles"
        if timed; then train "$try/$c" "$name" "$(part_of_budget 15)"; else
            train "$try/$c" "$name" test="${out}_test.csv" "$budget"
        fi
        [ $? -ne 1 ] || { cat "$out.notes" "$try/$c/log" > "$out.log"; tail -n 1 "$try/$c/log"; exit 1; }
    done
    if [ -z "$text" ]; then
        first=$won
        if better angles small 1 same; then won=angles; else won=small; fi
        text="joints as numbers: E_q $(typical small "$most") %; all hinges as angles: $(typical angles "$most") %"
        text="$text, after $most steps"
        if timed && [ "$most" -lt 10 ]; then won=$first text="$text, too few to compare: $first"; fi
    fi
    echo "$text" | tee -a "$out.notes"
fi
named=$name # the config of the one that goes on
start_step=$([ -f "$try/$won/log" ] && steps_of "$won" || echo 0)
began_training=$(date +%s)
if timed || [ ! -f "$try/$won/log" ]; then
    echo "training $name: $out.log"
    resume=resume=$([ -f "$try/$won/$name.check" ] && echo 1 || echo 0)
    train "$try/$won" "$name" test="${out}_test.csv" "$resume" "$(part_of_budget 60 35)"
    [ $? -ne 1 ] || { cat "$out.notes" "$try/$won/log" > "$out.log"; tail -n 1 "$try/$won/log"; exit 1; }
fi
spent=$(($(date +%s) - began_training))
if [ "$n" != "$N" ] && better full "$won" 0.5; then
    echo "$n coordinates: E_q $(typical "$won") %; all $N joints: $(typical full) %, so the model has all joints" |
        tee -a "$out.notes"
    won=full named=${name}_full n=$N start_step=0 spent=$spent_full
    timed || train "$try/full" "$named" test="${out}_test.csv" resume=1 "$budget"
fi
# follow CONFIG WHAT OPTIONS PART: the config of what won trains with OPTIONS in place of its networks, in that part of what is left
# of the budget. It replaces what won if it is 10 % better
follow() {
    echo "training $name, $2"
    place "$1" "$try/$won/$named.h" "$named" "$3"
    train "$try/$1" "$named" test="${out}_test.csv" "$(part_of_budget "$4")"
    if [ $? -eq 1 ]; then tail -n 1 "$try/$1/log"; else
        echo "networks of 16, 16: E_q $(typical "$won") %; $2: $(typical "$1") %"
        if better "$1" "$won" 0.9; then won=$1; fi
    fi > "$try/said"
    tee -a "$out.notes" < "$try/said"
}
angles=$(grep -c '^#define ROLN_ANGLES' "$try/$won/$named.h")
if [ "$n" -le $((4 - angles)) ] && { ! timed || [ "$(left 100)" -gt 15 ]; }; then
    degrees=$([ "$angles" -gt 0 ] && echo 2, 3 || echo 4, 7)
    follow polynomials "polynomials of degrees $degrees" "POLYNOMIALS $degrees\n#define ROLN_MASS squares, 6" 50
fi
if timed && [ "$won" != polynomials ]; then
    # a step of networks of 32, 32 takes about eight times as long
    can=$(awk -v s="$spent" -v k="$(($(steps_of "$won") - start_step))" -v t="$(left 80)" \
        'BEGIN { print (k > 0 && s > 0 ? int(t / (8 * s / k)) : t > 60 ? 100 : 0) }')
    if [ "$can" -ge 100 ] || { [ "$can" -ge 50 ] && by_itself "$won"; }; then
        follow wide 'networks of 32, 32' 'MLP 32, 32' 95
    fi
fi
if timed && [ ! -d "$try/wide" ] && ! by_itself "$won" && [ "$(left 100)" -gt 15 ]; then
    train "$try/$won" "$named" test="${out}_test.csv" resume=1 "$(part_of_budget 95)"
fi

# the model that won; weights of an earlier training stay as .old, unless those that are .old already are better
bad() { head -n 1 "$1" 2> /dev/null | grep -q '^/[*] train[.]c: '; }
if [ -f "${out}_weights.h" ] && ! { bad "${out}_weights.h" && [ -f "${out}_weights.h.old" ] && ! bad "${out}_weights.h.old"; }; then
    for f in .roln _weights.h; do [ ! -f "$out$f" ] || mv -f "$out$f" "$out$f.old"; done
fi
for file in "$try/$won/$named"*; do # under the name of the model
    case $file in
    *.check | *.roln) cp "$file" "$out.${file##*.}" ;;
    *) sed "s/$named/$name/g" "$file" > "$out${file#"$try/$won/$named"}" ;;
    esac
done
cp "$try/$won/log" "$out.log"
why=$(sed -n 's/^no trained model: //p' "$out.log" | tail -n 1)
errors "${out}_errors.csv" > "$out.own"
torques=$(awk '/^torques by/ { on = 1; next } /^M at/ { on = 0 } on && NF >= 4 && $1 ~ /^[0-9]+$/ { a += $2 ^ 2; e += $3 ^ 2 }
    END { if (a > 0) printf "%.3g", 100 * sqrt(e / a) }' "$out.log")

# The verdict. Exit codes: 0 useful, 3 not.
verdict=$(awk -v why="$why" -v torques="$torques" -v motors="$motors" -v steps="$(steps_of "$won")" -v budget="$budget" \
    -v held="$(grep -o 'dry friction holds a joint in [0-9]* %' "$out.notes" | head -n 1)" '
    function short(x) { return sprintf(x < 100 ? "%.2g" : "%.0f", x) }
    $1 > 0 && !ended {
        if ($2 > 5) { ended = 1; because = "E_q is " short($2) " % at " $1 " ms" }
        else if ($7 && $2 > $6 / 2) { ended = 1; because = "E_q at " $1 " ms is " short($2) " %, of q + h qd " short($6) " %" }
        else if (20 * $3 > $4) { ended = 1; because = $3 " of " $4 " roll-outs fail at " $1 " ms" }
        else far = $1
    }
    $1 > 80 && $1 < 120 { q = $2; qd = $5 }
    END {
        if (why ~ /before any step|no step predicts|before windows|windows ran away/) {
            sub(/;.*/, "", why)
            print "not useful: " why; exit
        }
        if (far < 80) verdict = "not useful: " because
        else {
            control = motors > 0 && q <= 1 && qd <= 5 && (torques == "" || torques <= 10)
            if (control) verdict = "useful for control, and for prediction up to " far / 1000 " s"
            else verdict = "useful for prediction up to " far / 1000 " s"
            if (!control && motors == 0) because = "there are no motors" (because == "" ? "" : "; " because)
            else if (!control && q > 1) because = "E_q is " short(q) " % at 100 ms, 1 % is the limit for control"
            else if (!control && qd > 5) because = "E_qd is " short(qd) " % at 100 ms, 5 % is the limit for control"
            else if (!control) because = "torques are off by " torques " %, 10 % is the limit for control"
            if (because != "") verdict = verdict ": " because
        }
        if (because != "" && held != "") verdict = verdict "; " held
        if (because != "" && steps < 100) verdict = verdict "; the training ended at step " steps ", by " budget
        print verdict
    }' "$out.own")
code=0
case $verdict in not*) code=3 ;; esac
{
    echo "joints $N motors $motors n $n"
    echo '   ms  q + h qd  all joints  learned     E_qd'
    awk -v same="$([ "$n" = "$N" ] && echo 1)" -F'[ ,]' '
        function short(x) { return sprintf(x < 100 ? "%.2g" : "%.0f", x) }
        FILENAME ~ /_constant.csv$/ { if (FNR > 1) constant[$1] = short($2) }
        FILENAME ~ /[.]full$/ { full[$1] = short($2) }
        FILENAME ~ /[.]own$/ { if (same) full[$1] = short($2)
            printf "%5s %9s %11s %8s %8s\n", $1, constant[$1], $1 in full ? full[$1] : "-", short($2), short($5) }' \
        "${out}_constant.csv" "$out.full" "$out.own"
    [ -z "$torques" ] || echo "torques of held-out samples are off by $torques % of their rms"
    sed -n 's/^#define ROLN_MLP /networks of /p; s/^#define ROLN_POLYNOMIALS /polynomials of degrees /p' "$out.h" |
        sed "s/$/, $(steps_of "$won") steps, $(($(date +%s) - began)) s in all/"
    sed -n 's/^/note /; 2,$p' "$out.notes"
    awk '$3 > 0 && $1 > 900 && $1 < 1100 { print "note " $3 " of " $4 " roll-outs of 1 s failed" }' "$out.own"
    [ -z "$why" ] || echo "note the trainer: no trained model: $why"
    [ $code -eq 0 ] || [ ! -f "${out}_weights.h.old" ] || echo "note the weights that were there before are ${out}_weights.h.old"
    echo "$verdict"
} > "$out.learn"
if [ $code -eq 0 ]; then rm -f "$out.roln.old" "${out}_weights.h.old"; fi
rm -rf "$try" "$out.own" "$out.full" "$out.notes"
cat "$out.learn"
exit $code
