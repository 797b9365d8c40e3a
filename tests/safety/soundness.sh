#!/bin/sh
# SPDX-License-Identifier: MIT
# soundness.sh - docs/soundness.md and docs/security.md name files, steps of the tests and targets of the Makefile that are there,
# and every step stands in the table of figures. Last line: N passed, N failed.
#
#   soundness.sh -w     writes that table from build/log, behind a whole `make release`
cd "$(dirname "$0")/../.." || exit 1
text=docs/soundness.md
steps=$(sed -n "/^steps/,/^end$/s/^\([a-z-]*\)  *[a-z].*/\1/p" tests/run.sh | grep -vx soundness | sort)
passed=0
failed=0
# what a step says of itself
said() {
    sed -n 's/^figure: //p' "build/log/$1" | paste -sd '~' | sed 's/~/; /g'
}

# Of the headers: figures are of one state.
state() {
    cat roln.h roln_ae.h roln_lnn.h roln_riem.h roln_spd.h | sha256sum | cut -c1-8
}

# Nonzero unless a step passed as many checks as the table says.
enough() {
    [ "$(sed -n '$s/ passed, .*//p' "build/log/$1")" -ge "$(sed -n "s/^| \`$1\` | \([0-9]*\) .*/\1/p" $text)" ]
}

# check TEXT: the word that is there, or not
check() {
    text_of=$1
    shift
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$text_of"; fi
}

if [ "$1" = -w ]; then
    {
        sed '/^<!-- evidence -->$/q' $text
        echo '| step | checks | seconds of a core | what it says |'
        echo '|---|---|---|---|'
        for s in $steps; do
            [ -f "build/log/$s" ] || { echo "no build/log/$s: make release" >&2; exit 1; }
            read -r code _ cpu < "build/log/$s.end"
            n=$(sed -n '$s/^\([1-9][0-9]*\) passed, 0 failed$/\1/p' "build/log/$s")
            [ "$code" = 0 ] && [ -n "$n" ] || { echo "$s failed" >&2; exit 1; }
            echo "| \`$s\` | $n | $cpu | $(said "$s") |"
        done
        echo
        echo "Written by \`make soundness\`, $(date +%Y-%m-%d), of the headers $(state)."
        sed -n '/^<!-- end of evidence -->$/,$p' $text
    } > build/soundness.md && mv build/soundness.md $text
    exit
fi

words=$(grep -ohE '`[^`]+`' docs/soundness.md docs/security.md | tr -d '`' | sort -u)
for f in $(echo "$words" | grep -oE '^(\.packaging|docs|examples|tests)/[^ ]*$'); do check "$f: no such file" test -e "$f"; done
for t in $(echo "$words" | sed -n 's/^make //p' | tr ' ' '\n' | grep -v =); do
    check "make $t: no such target" grep -q "^$t:" Makefile
done
for s in $(sed -n 's/^|.*| \([^|]*\) |$/\1/p' docs/soundness.md | grep -oE '`[a-z-]+`' | tr -d '`' | sort -u); do
    check "$s: no such step" grep -q "^$s  *[a-z]" tests/run.sh
done
for s in $steps; do check "$s: not in $text; sh tests/safety/soundness.sh -w" grep -q "^| \`$s\` | [1-9]" $text; done
for s in coverage mutants hash targets; do # what these say is the same each time
    [ ! -f "build/log/$s.end" ] || check "$s: says another thing than $text" grep -q "^| \`$s\` | .* | $(said $s) |$" $text
done
for s in $steps; do [ ! -f "build/log/$s.end" ] || check "$s: fewer checks than in $text" enough "$s"; done
grep -q "of the headers $(state)" $text || echo "the figures of $text are of other headers than these, $(state)"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
