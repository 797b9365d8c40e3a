#!/bin/sh
# Every C block of README.md, saved under the name in its first line, and every example compile with the lines `cc ...` that
# README.md and the heads of the examples give: by gcc and clang, without a warning. Blocks and examples that train nothing run.
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
# block n of README.md is build/readme/NAME.c if it begins with /* NAME.c, else blockn.c
awk '/^```c$/ { n++; on = 1; file = ""; next } /^```$/ { on = 0 }
     on && file == "" { file = "block" n ".c"; if ($1 == "/*" && $2 ~ /^[a-z_]+[.]c$/) file = $2 }
     on { print > ("build/readme/" file) }' README.md
blocks=$(cd build/readme && echo *.c)
lines=$(sed -n 's/^ *\(cc -std=[^*]*\).*/\1/p' README.md examples/*.c | sed 's/ *$//' | sort -u)
# no example and no block without its line, no line twice in different words
for f in $blocks examples/*.c; do
    check "[ \$(echo '$lines' | grep -c ' $f ') -eq 1 ]"
done
warn='-O1 -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wcast-qual -Wvla -Werror'
lines="$lines
$(echo "$lines" | sed -n 's/=pend16 /=pend2 /p')"
for cc in gcc clang; do
    while read -r line; do # the same line, but for the compiler, the place of what it reads and writes, and the warnings
        check "$(echo "$line" |
            sed "s|^cc |$cc $warn |; s| -O3 | |; s| -o | -o build/readme/|; s| \([a-z_]*[.]c\) | build/readme/\1 |")"
    done << END
$lines
END
done
for f in $blocks spd.c control_tick.c; do
    check "build/readme/${f%.c}"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
