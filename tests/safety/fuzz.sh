#!/bin/sh
# SPDX-License-Identifier: MIT
# fuzz.sh - the targets of libFuzzer, fuzz_*.c: each claims what its comment says, under every sanitizer that it was built with.
#
#   fuzz.sh test       a minute in all, from the committed inputs, tests/safety/corpus, with fixed seeds. Last line: N passed, N
#                      failed
#   fuzz.sh SECONDS [KIND/TARGET ..]
#                      all of them, or these, each for so long, JOBS at a time, on from the inputs that were found before,
#                      build/fuzz/corpus; then a table of all runs so far of these headers, whose calls are added up in
#                      build/fuzz/total.STATE. What breaks is kept in build/fuzz/found, and the exit code is 1 then
#   fuzz.sh table      the table alone
#
# Calls are those of what is tested: packets read, frames taken and answered, files read, functions called; an input holds several.
cd "$(dirname "$0")/../.." || exit 1
out=build/fuzz
total=$out/total.$(cat roln*.h tests/safety/fuzz*.[ch] | cksum | cut -d ' ' -f 1)
all='au/packed m/packed au/frames m/frames au/csv m/csv au/calls m/calls'
more='audouble/packed audouble/calls none/packed none/frames none/csv none/calls' # double; without a sanitizer, at full speed

# one KIND/TARGET SECONDS CORPUS SEED: inputs that reach new code are added to CORPUS; adds a line to runs: calls, inputs, seconds,
# exit code. -entropic=0: to count how rare a feature is takes longer than the calls
if [ "$1" = one ]; then
    kind=${2%/*} target=${2#*/} log=$out/log/${2%/*}-${2#*/}
    mkdir -p "$4" $out/found $out/log
    [ "$target" = csv ] && set -- "$@" -dict=tests/safety/corpus/csv.dict
    corpus=$4 seed=$5 seconds=$3 code=0
    shift 5
    "$out/$kind/fuzz_$target" -max_total_time="$seconds" -seed="$seed" -timeout=30 -max_len=512 -len_control=0 -entropic=0 \
        -print_final_stats=1 -artifact_prefix="$out/found/$kind-$target-" "$@" "$corpus" "tests/safety/corpus/$target" \
        > "$log" 2>&1 || code=$?
    awk -v run="$kind/$target" -v code=$code -v seconds="$seconds" '/^calls / { c = $2 } /number_of_executed_units/ { n = $2 }
        END { print run, c + 0, n + 0, seconds, code }' "$log" >> "$out/runs.$runs"
    exit 0
fi

table() {
    echo '| target | sanitizer | calls | inputs | seconds | findings |'
    echo '|---|---|---|---|---|---|'
    awk '{ c[$1] += $2; n[$1] += $3; s[$1] += $4; f[$1] += $5 != 0 }
        END { for (r in c) { split(r, k, "/")
                  printf "| %s | %s | %.0f | %.0f | %d | %d |\n", k[2], k[1], c[r], n[r], s[r], f[r] } }' \
        $total | sort
}

mkdir -p $out
case $1 in
table) table ;;
test)
    rm -rf $out/test $out/runs.test
    for r in $all; do runs=test sh tests/safety/fuzz.sh one "$r" 7 "$out/test/$r" 1; done
    while read -r run calls inputs seconds code; do
        echo "$run: $calls calls, $inputs inputs"
        [ "$code" -eq 0 ] && [ "$calls" -gt 0 ] || tail -n 40 "$out/log/${run%/*}-${run#*/}" | cut -c1-200
    done < $out/runs.test
    awk '{ if ($5 == 0 && $2 > 0) passed++; else failed++
           if ($1 ~ /calls/) calls += $2; else parsers += $2 }
        END { if (NR != 8) failed++
              print "figure: " parsers " calls of parsers, " calls " of all else, under sanitizers"
              print passed + 0 " passed, " failed + 0 " failed"; exit failed > 0 || passed == 0 }' $out/runs.test
    ;;
*)
    seconds=${1:-300}
    [ $# -eq 0 ] || shift
    [ $# -gt 0 ] || set -- $all $more
    for r in "$@"; do echo "$r $seconds $out/corpus/${r#*/} 0"; done |
        runs=$$ xargs -P "${JOBS:-1}" -L 1 sh tests/safety/fuzz.sh one
    cat $out/runs.$$ >> $total
    table
    awk -v want=$# '$5 != 0 || $2 == 0 { bad++ } END { exit bad > 0 || NR != want }' $out/runs.$$
    code=$?
    rm $out/runs.$$
    exit $code
    ;;
esac
