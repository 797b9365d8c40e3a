#!/bin/sh
# The report of made-up results: statistics over seeds, missing runs, goals, notes, and pictures that are well-formed XML.
cd "$(dirname "$0")/../.." || exit 1
make -s build/report || exit 1
dir=build/test_report
rm -rf $dir
mkdir -p $dir/in $dir/out $dir/empty
passed=0
failed=0
check() { # what is wrong if it fails, command
    what=$1
    shift
    if "$@" > $dir/log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$what: $*"
        cat $dir/log
    fi
}
has() { check "not in RESULTS.md" grep -qF -e "$1" $dir/out/RESULTS.md; }
well_formed() {
    if command -v xmllint; then xmllint --noout "$1"
    elif command -v python3; then python3 -c 'import sys, xml.dom.minidom; xml.dom.minidom.parse(sys.argv[1])' "$1"
    else [ "$(tail -n 1 "$1")" = '</svg>' ]
    fi
}
result() { # run, E_q 25, E_q 1000, E_q whole
    printf '%s\n' "run $1 1" 'trajectories train 97' 'parameters all 11935' 'samples million 7.04' 'seconds train 1800' \
        "E_q 25 $2" "E_q 1000 $3" "E_q whole $4" 'trivial 25 4' 'seconds all 3600' > $dir/in/$1.txt
}

result pend16-acc-1 1 20 30
result pend16-acc-2 3 40 nan
result pend16-long-1 0.4 5 1e30
result pend16-pod-1 20 60 70
result pend16-opinf-1 23 48 80
result pend2-exp-acc-1 0.1 1 1
result pend2-exp-acc-2 0.9 1 1
result pend2-exp-acc-4 0.2 1 1
echo 'failed whole 2' >> $dir/in/pend16-acc-2.txt
for n in 5 10 20 40; do
    result pend2-few$n-exp-1 1 $((100 / n)) $((200 / n))
    result pend2-few$n-exp-2 1 $((150 / n)) $((300 / n))
done
for whose in true predicted; do
    for ms in 0 250 500 750 1000; do
        echo "path $whose $ms 0 0 0 50 -10 -90 $((100 - ms / 5)) 20 -180"
    done > $dir/in/$whose
    for ms in 0 62 125 187 250; do
        awk "BEGIN { printf \"path $whose $ms\"; for (i = 0; i < 200; i++) printf \" %d %d 155\", 20 * int(i / 10), 20 * (i % 10)
                     print \"\" }"
    done > $dir/in/$whose-cloth
done
cat $dir/in/true $dir/in/predicted > $dir/in/rope-n10-1.path
cat $dir/in/true-cloth $dir/in/predicted-cloth > $dir/in/cloth-n10-1.path
cat > $dir/in/speed.md << 'END'
A table of speeds.

| | pend16 | rope |
|---|---|---|
| us per mj_step | 31 | 81 |
| **faster**, MuJoCo at its standard step, the model at its largest stable one: latent | **reduced**, 12.6 times | **MuJoCo**, 2 times |
END
printf '## 5. Speed\n\nFirst.\n\n### Within\n\nLast.\n\n## pend2: errors\nUnder a table.\n\n' > $dir/out/notes.md
printf '## pend3\nNowhere.\n' >> $dir/out/notes.md

check 'no report' sh -c "build/report $dir/in $dir/out 2> $dir/stderr"
check 'an unknown note passes' [ "$(cat $dir/stderr)" = 'notes.md: no heading `pend3`' ]
# mean ± standard deviation (median); a value that is not finite; one seed; none
has '| RO-LNN, acc | - | 2.0 ± 1.4 (2.0) | 30 ± 14 (30) | inf (inf) |'
has '| exp, acc | - | 0.40 ± 0.44 (0.20) | 1.0 | 1.0 | - | - |'
has '| RO-LNN, long | - | 0.40 | 5.0 | 1.0e30 |'
has '| RO-LNN, ode | - | - | - | - | - |'
has '| q + h qd | - | 4.0 | - | - |'
# failed is 0 if it is not there
has '| 1.0 ± 1.4 (1.0) |'
has '| exponential, 1 s | 25 ± 7.1 (25) | 12 ± 3.5 (12) | 6.0 ± 1.4 (6.0) | 2.5 ± 0.71 (2.5) |'
# run list
has '| pend16-acc | pend16 | 97 | 2 of 5 | 11935 | 7.04 | 1800 | 3600 |'
has '| pend16-opinf | pend16 | 97 | 1 | 11935 | 7.04 | 1800 | 3600 |'
has '16.00 core-hours; the longest run took 60 minutes.'
has 'pend2-exp-acc-3 5, pend2-exp-ode, '
has ', pend16-acc-3 4 5, '
# goals
has '| 0.40 | met |'
has '| 0.40, q + h qd 4.0: 10 times | met |'
has '| 0.40, pend16-pod 20: 50 times | - |' # one baseline is not there
has 'pend16: 10 times faster than mj_step, latent | section 5 | 13 times | met |'
has 'rope: 50 times faster than mj_step, latent | section 5 | 0.50 times | **missed** |'
has 'cloth: 50 times faster than mj_step, latent | section 5 | - | - |'
has '| rope, n = 10: whole 1 s at most 3 % | rope-n10 | - | - |'
# notes under their headings
check 'note' sh -c "grep -A 9 '^## 5. Speed' $dir/out/RESULTS.md | tr '\n' '/' |
    grep -qF '## 5. Speed//First.//### Within//Last.//A table of speeds.//'"
check 'note of a table' sh -c "grep -A 2 '^### pend2: errors' $dir/out/RESULTS.md | tail -n 1 | grep -qx 'Under a table.'"
# pictures: those that have data, and no other
for name in $(sed -n 's/^!\[.*](\(.*\))$/\1/p' $dir/out/RESULTS.md); do
    check 'not well-formed' well_formed $dir/out/"$name"
done
check 'pictures' [ "$(cd $dir/out && echo *.svg)" = 'cloth.svg pend16.svg pend2_few.svg rope.svg structure.svg' ]
check 'a number in a picture' sh -c "! grep -Ei '[^a-z](nan|inf)[^a-z]' $dir/out/*.svg"
# no run at all
check 'empty' build/report $dir/empty $dir/empty
check 'pictures of nothing' [ "$(ls $dir/empty)" = RESULTS.md ]

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
