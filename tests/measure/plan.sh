#!/bin/sh
# SPDX-License-Identifier: MIT
# plan.sh - what plans take on a Cortex-M7 (tests/measure/plan.c), and that they are the same bits on every core as on this machine.
#
#   plan.sh [CORE ..]   1,000 plans: the table of docs/control.md, between `<!-- plans -->` and `<!-- end of plans -->`; and the
#                       most that a plan can take, over 30 of them (plan.c: longest_plan)
#   plan.sh -w          ... into that text
#   plan.sh test        the first 40 of them: instructions lie within those of the text, a tenth more with other compilers
#
# Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
out=build/plansize
text=docs/control.md
plans=1000 mode=all
case $1 in
test) plans=40 mode=test; shift ;;
-w) mode=write; shift ;;
esac
cores=${*:-m4 m7 rv32}
mkdir -p $out
passed=0
failed=0
ok() { if eval "$2"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$1"; fi; }

# run core width rate: its line; worst=-DWORST: along the longest way
run() {
    image=$out/$1-$2$3$worst.elf
    sh examples/firmware/cc.sh "$1" -Iexamples/firmware -DWIDE="$2" -DPLANS=$plans $3 $worst tests/measure/plan.c -o "$image" &&
        timeout 900 sh examples/firmware/run.sh "$1" "$image"
}
: > $out/rows
for kind in '32' '64' '32 -DRATE'; do
    want=$(run host $kind | sed 's/ bytes.*//')
    echo "$kind: $want"
    ok "$kind: a torque beyond a limit, or few at one" \
        'echo "$want" | awk "{ exit !(\$2 == $plans && \$4 > .3 * \$2 && \$6 == 0) }"'
    for core in $cores; do
        [ "$kind$core" != 32m7 ] && [ "$kind" != 32 ] && [ "$core" != m7 ] && continue
        line=$(run "$core" $kind)
        ok "$kind on $core: $line" '[ "$(echo "$line" | sed "s/ bytes.*//")" = "$want" ]'
        [ "$core" = m7 ] || continue
        most=$(worst=-DWORST plans=30 && run m7 $kind | sed 's/.* worst //')
        ok "$kind: no worst case, or a plan above it" 'echo "$line $most" | awk "{ exit !(\$15 >= \$13) }"'
        echo "$kind: $line $most" >> $out/rows
    done
done
sed 's/-DRATE/and limits of rate/' $out/rows | awk -F': ' '{ split($2, w, " "); name = $1; sub(/^[0-9]+/, "& x 2", name)
    printf "| %s | %.2f | %.2f-%.2f | ", name, w[14] / 1e6, w[12] / 1e6, w[13] / 1e6
    printf "%.2f | %.1f |\n", w[15] / 1e6, w[10] / 1e3 }' > $out/table
cat $out/table
if [ $mode = write ]; then
    awk -v table=$out/table '/<!-- plans -->/ {
        print
        print "| networks | instructions of a plan, millions: mean | least and most | at worst | plan and scratch, kB |"
        print "|---|---|---|---|---|"; while ((getline line < table) > 0) print line; skip = 1 }
        /<!-- end of plans -->/ { skip = 0 } !skip' $text > $out/text && cp $out/text $text
fi
sed -n '/<!-- plans -->/,/<!-- end of plans -->/p' $text | grep '^| [0-9]' > $out/said
ok "not the table of $text" 'awk -F"|" "
    { split(\$4, r, \"-\") }
    NR == FNR { low[\$2] = r[1]; high[\$2] = r[2]; worst[\$2] = \$5; ram[\$2] = \$6; n++; next }
    { n--; if (!(\$2 in low) || \$6 + 0 != ram[\$2] + 0 || \$5 > 1.1 * worst[\$2] || \$5 < .9 * worst[\$2]) bad = 1
      if (r[1] < .9 * low[\$2] || r[2] > 1.1 * high[\$2]) bad = 1 }
    END { exit bad || n != 0 }" $out/said $out/table'
echo "$passed passed, $failed failed"
[ $failed -eq 0 ]
