#!/bin/sh
# SPDX-License-Identifier: MIT
# upsets.sh - single-event upsets, injected into a closed loop in QEMU (tests/firmware/upsets.c), counted.
#
#   upsets.sh [RUNS]      RUNS of them, 100,000, half on a Cortex-M4F and half on RV32, JOBS cores at a time: the table of
#                         docs/firmware.md, between `<!-- upsets -->` and `<!-- end of upsets -->`
#   upsets.sh -w [RUNS]   ... into that text
#   upsets.sh [-w] count  ... of the runs that are there, without new ones
#   upsets.sh test        2,000 runs, against the table of the text
#
# OPTIONS=-DONE_LIMIT=1 upsets.sh RUNS: a guard without limits of each joint and of rate. Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
out=build/upsets
text=docs/firmware.md
runs=100000 count= write=
for word in "$@"; do
    case $word in
    test) runs=2000 ;;
    count) count=yes runs=$(cat $out/m4.log $out/rv32.log | awk '!seen[$2]++ { n++ } END { print 2 * n }') ;;
    -w) write=yes ;;
    *) runs=$word ;;
    esac
done
warn='-Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Werror'
passed=0
failed=0
ok() { if eval "$2"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$1"; fi; }

# part core first last: these runs, their lines appended to core.log. QEMU ends where it cannot go on (a fault in a fault: lockup),
# is ended where the image has lost what a reset should leave, or hangs with interrupts off: a watchdog outside would reset, l.
# Semihosting is off: what a wild program says is not to reach this machine.
part() {
    core=$1 next=$2 last=$3 options=
    [ "$core" = rv32 ] && options='-icount shift=7'
    while [ "$next" -le "$last" ]; do
        rm -f $out/"$core".in $out/"$core".out
        mkfifo $out/"$core".in $out/"$core".out
        timeout 300 sh examples/firmware/run.sh "$core" $out/"$core".elf $options -semihosting-config enable=off \
            < $out/"$core".in > $out/"$core".out 2> $out/"$core".err &
        machine=$!
        exec 3> $out/"$core".in 4< $out/"$core".out
        read -r _ <&4 # "up"
        end=$((next + 999 < last ? next + 999 : last))
        echo "$next $end 1" >&3
        awk '/^u [0-9]+ [0-7] / && NF == 15 && $3 == $2 % 8 { print; fflush() }
            $1 == "end" || $1 == "up" { exit } $1 == "bytes"' <&4 > $out/"$core".part
        exec 3>&- 4<&-
        kill $machine 2> /dev/null
        wait $machine 2> /dev/null
        grep '^bytes' $out/"$core".part > $out/"$core".bytes
        grep '^u' $out/"$core".part >> $out/"$core".log
        reached=$(awk -v at="$next" '$1 == "u" && $2 == at { at++ } END { print at }' $out/"$core".part) # in sequence
        if [ "$reached" -le "$end" ]; then
            echo "u $reached $((reached % 8)) 0 l 0 0 0 - 0 - 0 0 0 0" >> $out/"$core".log
            reached=$((reached + 1))
        fi
        next=$reached
    done
}

mkdir -p $out
each=$((runs / 2))
for core in m4 rv32; do
    [ $count ] && continue
    rm -f $out/$core.log
    sh examples/firmware/cc.sh $core $warn $OPTIONS -Wl,--wrap=systick tests/firmware/upsets.c -o $out/$core.elf || exit 1
    part $core 1 $each &
    [ "${JOBS:-2}" -gt 1 ] || wait
done
wait

# Of each run: what the guard finds, and what guard and checks find, at which tick; and where the motion is then.
# 2 run 3 region 4 words 5 end 6 ticks 7 guard 8 faults 9 check 10 checks 11 away 12 differs 13 largest 14 beyond 15 caller
awk -v each=$each '
function class(found, away, differs) {
    if (found >= 0) return away == "-" || found <= away ? "found" : "late"
    return away != "-" ? "wrong" : differs ? "harmless" : "none"
}
FNR == 1 { core++ }
$1 == "bytes" { for (i = 2; i <= NF; i++) bytes[i - 2] += $i / 2; next }
{
    if ($2 > each || seen[core, $2]++) next # what a wild program printed; what was run twice
    if ($5 == "?") { seen[core, $2] = 0; next } # its second line counts: it came too late
    r = $3; n[r]++
    if (r == 5 || r == 6) { words[r] += $4; counted[r] += $4 > 0 }
    guard = $5 != "." ? $6 + 0 : $7 == "-" ? -1 : $7 + 0 # a fault, a time limit, a reset: found
    any = guard >= 0 && ($9 == "-" || guard <= $9) ? guard : $9 == "-" ? -1 : $9 + 0
    a = class(guard, $11, $12); b = class(any, $11, $12)
    # the program went on elsewhere, in the code of the test: no tick was judged
    if ($5 == "." && $6 == 0) { a = b = "wrong"; strayed++ }
    A[r, a]++; B[r, b]++
    if ($5 != ".") ended[r]++
    if ($5 == "l") lost++
    size = $13 ~ /[*]/ ? 4e6 : $13 + 0 # **** is more
    if (size > largest[r]) largest[r] = size
    if ($14) beyond[r]++
    if ($15) caller[r]++
}
END {
    split("none found late harmless wrong", kind, " ")
    split("weights settings constants state scratch stack registers code", name, " ")
    bytes[7] = bytes[5]
    for (r = 5; r <= 6; r++) bytes[r] = 4 * words[r] / counted[r]
    for (r = 0; r < 8; r++) {
        printf "%s %.0f %d", name[r + 1], bytes[r], n[r]
        for (k = 1; k <= 5; k++) printf " %d %d", A[r, kind[k]], B[r, kind[k]]
        printf " %.2f %d %d %d\n", largest[r], beyond[r], caller[r], ended[r]
    }
    printf "lost %d strayed %d\n", lost, strayed
}' $out/m4.bytes $out/m4.log $out/rv32.bytes $out/rv32.log > $out/counts

# the table in %, and the mean of its rows by bytes: a bit anywhere
awk '
function row(name, bytes, v, largest, k) {
    printf "| %s | %s ", name, bytes
    for (k = 1; k <= 10; k++) printf "| %." (k % 5 == 0 || k % 5 == 3 ? 2 : 1) "f ", v[k]
    printf "| %s |\n", largest
}
function limited(x) { return x >= 4e6 ? "> 4e6" : sprintf("%.2f", x) }
NF > 10 {
    for (k = 1; k <= 5; k++) { v[k] = 100 * $(2 * k + 2) / $3; v[k + 5] = 100 * $(2 * k + 3) / $3 }
    for (k = 1; k <= 10; k++) sum[k] += v[k] * $2
    total += $2
    if ($14 + 0 > largest) largest = $14 + 0
    row($1, $2, v, limited($14))
}
END {
    for (k = 1; k <= 10; k++) v[k] = sum[k] / total
    row("a bit anywhere", sprintf("%d", total), v, limited(largest))
}' $out/counts > $out/table
cat $out/counts $out/table
echo "figure: $((2 * each)) runs"

if [ $write ]; then
    awk -v table=$out/table '/<!-- upsets -->/ {
        print
        printf "| struck | bytes | guard: no effect | found | late | harmless | wrong "
        print "| checks, too: no effect | found | late | harmless | wrong | torque |"
        print "|---|---|---|---|---|---|---|---|---|---|---|---|---|"; while ((getline line < table) > 0) print line; skip = 1 }
        /<!-- end of upsets -->/ { skip = 0 } !skip' $text > $out/text && cp $out/text $text
fi
sed -n '/<!-- upsets -->/,/<!-- end of upsets -->/p' $text | grep '^| [a-z].* [0-9]' > $out/said

# $1 name 2 bytes 3 runs 4, 5 no effect 6, 7 found 8, 9 late 10, 11 harmless 12, 13 wrong, of guard, of both; 14 largest 15 beyond
# 16 registers of the caller damaged 17 ended by a fault or a time limit
ok 'runs are missing' 'awk -v n=$((2 * each)) "NF > 10 { n -= \$3 } END { exit n != 0 }" $out/counts'
ok 'no upset has ended the program' 'awk "NF > 10 { n += \$17 } END { exit !(n > 0) }" $out/counts'
for struck in weights settings constants code; do # but for flips in the code that sums
    ok "$struck: what the checks sum is struck, and they do not find it" \
        'awk -v r=$struck "\$1 == r { ok = \$7 + \$9 >= (r == \"code\" ? .995 : 1) * \$3 } END { exit !ok }" $out/counts'
done
# but for a torque that is struck on its way from the guard to the motor
ok 'data: a torque beyond a limit has reached a motor' \
    'awk "\$1 != \"code\" && NF > 10 { n += \$15; m += \$3 } END { exit n > m / 10000 }" $out/counts'
ok 'the checks do not divide what is wrong by ten' \
    'awk "NF > 10 { a += \$12 * \$2 / \$3; b += \$13 * \$2 / \$3 } END { exit !(a > 0 && b < a / 10) }" $out/counts'
# the shares of the text, within four deviations of what so many runs say, and 1.5 %
ok "not the table of $text" 'awk -F"|" -v runs=$((each / 4)) "
    NR == FNR { for (k = 4; k <= 13; k++) want[\$2, k] = \$k; n++; next }
    { n--; if (\$2 ~ /anywhere/) next
      for (k = 4; k <= 13; k++) { p = want[\$2, k] / 100; d = \$k / 100 - p; if (d < 0) d = -d
          if (want[\$2, k] == \"\" || d > .015 + 4 * sqrt(p * (1 - p) / runs)) { print \$2, k, \$k, want[\$2, k]; bad = 1 } } }
    END { exit bad || n != 0 }" $out/said $out/table'
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
