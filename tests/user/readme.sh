#!/bin/sh
# SPDX-License-Identifier: MIT
# Every C and C++ block of README.md and docs/*.md, saved under the name in its first line, and every example compile with the lines
# `cc ...` that these texts and the heads of the examples give: by gcc and clang, without a warning. Blocks and examples that train
# nothing run; a block `console` holds what one prints. Every test that docs/*.md name is there, and every file that these texts
# link to. Figures that stand in two texts are the same; docs/api.md is that of roln.h; README has 1,500 words at most.
cd "$(dirname "$0")/../.." || exit 1
mkdir -p build/readme
rm -f build/readme/*
passed=0
failed=0
check() {
    if sh -c "$1" > build/readme/log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$1"
        cat build/readme/log
    fi
}
texts="README.md CONTRIBUTING.md $(echo docs/*.md)"
# block n of all is build/readme/NAME.c if it begins with /* NAME.c, else blockn.c; NAME.want: what `$ ./NAME` prints
awk '/^```c(pp)?$/ { n++; on = 1; file = ""; next } /^```$/ { on = 0 }
     on && file == "" { file = "block" n ".c"; if ($1 == "/*" && $2 ~ /^[a-z_]+[.]c(pp)?$/) file = $2 }
     on { print > ("build/readme/" file) }
     /^```console$/ { getline; want = "build/readme/" substr($2, 3) ".want"
                      while ((getline line) > 0 && line != "```") print line > want }' $texts
blocks=$(cd build/readme && echo *.c *.cpp)
# NAME.cpp becomes NAMEpp, which prints what NAME does
for f in build/readme/*.cpp; do cp "${f%.cpp}.want" "${f%.cpp}pp.want" || exit 1; done
lines=$(sed -n 's/^ *\(c[c+]*[c+] -std=[^*]*\).*/\1/p' $texts examples/*.c | sed 's/ *$//' | sort -u)
# no example and no block without its line, no line twice in different words
for f in $blocks examples/*.c; do
    check "[ \$(echo '$lines' | grep -c ' $f ') -eq 1 ]"
done
warn='-O1 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wcast-qual -Wvla -Werror'
lines="$lines
$(echo "$lines" | sed -n 's/=pend16 /=pend2 /p; s/=arm /=pend16 /p')"
for cc in gcc clang; do
    while read -r line; do # the same line, but for the compiler, the place of what it reads and writes, and the warnings
        check "$(echo "$line" | sed "s|^cc |$cc $warn |; s|^c++ |$(echo $cc | sed 's/gcc/g/')++ $warn |; s| -O3 | |
            s| -o | -o build/readme/|; s| \([a-z_]*[.]c\) | build/readme/\1 |; s| \([a-z_]*[.]cpp\) | build/readme/\1 |")"
    done << END
$lines
END
done
for f in $blocks spd.c control_tick.c; do
    f=build/readme/$(echo "$f" | sed 's/[.]cpp$/pp/; s/[.]c$//')
    if [ -f "$f.want" ]; then check "$f | diff $f.want -"; else check "$f"; fi
done
for f in build/readme/*.want; do check "[ -x ${f%.want} ]"; done
# tests/../FILE.c: NAME is a function of that file, wherever it lies
for t in $(grep -oh 'tests/[a-z/_]*[.]c: [a-z_0-9]*' $texts | sed 's/: /:/' | sort -u); do
    check "cat \$(find tests -name $(basename "${t%:*}") | sort) | grep '${t#*:}('"
done
# README's bytes are those of docs/firmware.md, which make sizes compares
for m in chain pend16; do
    bytes=$(grep "^| $m, [0-9]" docs/firmware.md | head -n 1 | grep -oE '[0-9]{4,}' | head -n 3)
    check "[ '$(grep "^| $m:" README.md | grep -oE '[0-9]{4,}')' = '$bytes' ]"
done
# README's RAM of observer and filter by leapfrog is that of docs/firmware.md
for c in 8 7; do
    bytes=$(awk -F '[|] *' -v c=$c '/^[|] (chain|pend16), [0-9]+ joints/ { printf "%d ", $c }' docs/firmware.md)
    check "tr '\n' ' ' < README.md | grep ' $(echo $bytes | sed 's/ / and /')'"
done
# README's MHz for 1 kHz are twice the instructions of task.md: of a tick; and of the observer; or of the filter by leapfrog
for m in chain pend16; do
    mhz=$(awk -F '[|] *' -v m="$m, M4F " '$2 == m { printf "%.0f/%.0f/%.0f", 2 * $3, 2 * ($3 + $7), 2 * ($3 + $6) }' docs/task.md)
    check "[ '$(grep "^| $m:" README.md | awk -F '[|] *' '{ print $7 }' | tr -d ', ')' = '$mhz' ]"
done
# MHz that evidence adds for 1 kHz: from twice the instructions of firmware.md of a tick, without and with it
more=$(awk -F '[|] *' '/^[|] (chain|pend16), M4F [|] [0-9.]+ [|]/ {
    printf "%.0f ", 2 * ($9 - $3) }' docs/firmware.md)
check "grep 'evidence.* adds $(echo $more | sed 's/ / and /') MHz' README.md"
for f in docs/firmware.md docs/task.md; do
    check "grep 'evidence. adds $(echo $more | sed 's/ / MHz (chain) or /') MHz (pend16)' $f"
done
# task.md's instructions of a tick, a step, filters and an observer at worst are those of docs/firmware.md, too
worst() { awk -F '[|] *' "$1" "docs/$2.md" | tr -d ' '; }
worst '/^[|] (chain|pend16), [A-Z0-9]+ [|] [0-9.]+ [|] [0-9.]+ [|]/ { print $2 "," $3 "," $4 "," $5 "," $6 "," $7 }' \
    task > build/readme/task.worst
worst '/^[|] (chain|pend16), [A-Z0-9]+ [|] [0-9.]+ [|]/ { for (i = 4; i < 8; i++) sub(".*/", "", $i)
    print $2 "," $3 "," $4 "," $5 "," $6 "," $7 }' firmware > build/readme/firmware.worst
check '[ -s build/readme/task.worst ] && diff build/readme/task.worst build/readme/firmware.worst'
# docs/api.md is what make api prints of the arm
check 'python3 tests/user/api.py examples/arm.h | diff docs/api.md -'
# README is short
check '[ "$(wc -w < README.md)" -le 1500 ]'
# a link within the repository leads to a file
for f in $texts; do
    for l in $(grep -o ']([^)#]*' "$f" | sed 's/](//' | grep -v '^http' | sort -u); do check "[ -e $(dirname "$f")/$l ]"; done
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
