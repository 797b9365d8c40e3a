# SPDX-License-Identifier: MIT
# means.sh - what heads.sh and next.sh print of trainings that differ in their seed alone. Sourced.

# run LOG COMMAND ..: trained with its output in LOG, and LOG.done behind it; one that is not useful counts, one that was killed not
run() {
    log=$1 code=0
    shift
    [ ! -f "$log.done" ] || return 0
    "$@" > "$log" 2>&1 || code=$?
    case $code in 0 | 3) touch "$log.done" ;; esac
}
# means_heading WIDTH
means_heading() {
    printf "%-$1s %22s %22s %22s %22s %22s\n" 'E_q, %: mean (each seed)' '25 ms' '1 s' '1 s, median window' '1 s, 90 %' '3 s'
}
# means WIDTH ROW LOG ..: of the test recordings; a mean is that of all seeds, or -
means() {
    width=$1 row=$2
    shift 2
    for log; do
        awk '/test.csv$/ { on = 1 } on && $1 == 25 { a = $2 } on && $1 == 1000 { b = $2; median = $4; most = $5 }
            on && NF >= 11 && $1 ~ /^[0-9]+$/ { c = $2 } # a remark may follow
            END { printf "%s,%s,%s,%s,%s\n", a, b, median, most, c }' "$log"
    done | awk -F, -v width="$width" -v row="$row" '
        { for (i = 1; i <= 5; i++) {
            there = $i ~ /^[0-9.]+(e[+-]?[0-9]+)?$/
            sum[i] += $i; missing[i] += !there
            each[i] = each[i] (NR > 1 ? ", " : "") (there ? sprintf("%.2g", $i) : "-") } }
        END { printf "%-" width "s", row
              for (i = 1; i <= 5; i++) printf " %22s", (missing[i] ? "-" : sprintf("%.2g", sum[i] / NR)) " (" each[i] ")"
              print "" }'
}
