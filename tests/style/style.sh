#!/bin/sh
# SPDX-License-Identifier: MIT
# style.sh - what a compiler does not see: widths, blanks, names, lengths of functions and their parameters. Last line: N passed,
# N failed.
#
#   style.sh                everything
#   style.sh table [DIR]    a table of the headers, of this repository or of the one in DIR: longest functions, most parameters
#
# A function is 60 lines long at most, from its first to its last, or the comment above it says why: Long: REASON.
[ "$1" = table ] && [ -n "$2" ] && root=$2
style=$(cd "$(dirname "$0")" && pwd)
cd "${root:-$style/../..}" || exit 1
headers='roln.h roln_ae.h roln_lnn.h roln_riem.h roln_spd.h'
# words in capitals that are not ours: of the standard library, and of compilers
foreign='NULL|STDC|FP_CONTRACT|OFF|U?INT(8|16|32|64)_(C|MAX|MIN)|INT_MAX|FLT_EVAL_METHOD|HUGE_VALF?'
export LC_ALL=C

functions() { awk -f "$style/strip.awk" "$1" | awk -v file="$1" -f "$style/functions.awk"; }

if [ "$1" = table ]; then
    echo '| header | functions | longest, lines | over 60, no reason | most parameters | over 8, 10 | lines over 132 columns |'
    echo '|---|---|---|---|---|---|---|'
    for h in $headers; do
        functions "$h" | awk -v wide="$(grep -cE '^.{133}' "$h")" '
            { n++; if ($4 > most) { most = $4; long = $3 } if ($4 > 60 && !$6) over++
              if ($5 > many) { many = $5; crowd = $3 } if ($5 > 8) eight++; if ($5 > 10) ten++ }
            END { printf "| %s | %d | %s %d | %d | %s %d | %d, %d | %d |\n", $1, n, long, most, over + 0, crowd, many,
                         eight + 0, ten + 0, wide }'
    done
    exit
fi

mkdir -p build
wrong=build/style.wrong
passed=0
failed=0
# check TEXT: nothing is in $wrong
check() {
    if [ -s $wrong ]; then failed=$((failed + 1)); echo "$1:"; head -n 50 $wrong | sed 's/^/    /'; else passed=$((passed + 1)); fi
}

# what is written by hand: weights, pictures, models, results and logs are written by programs
all=$(find roln*.h Makefile .ci .packaging .clang-format .editorconfig examples tests -type f ! -name '*.svg' ! -name '*.log' \
    ! -name '*.roln' ! -name '*.md' ! -name '*_weights.h' ! -name '*_limits.h' ! -name '*.pyc' ! -name results.txt \
    ! -path '*/safety/corpus/*' | sort)
code=$(echo "$all" | grep '[.][ch]$')
tab=$(printf '\t')

echo "$all" | xargs grep -nE '^.{133}' | cut -c1-100 > $wrong
check 'more than 132 columns'
echo "$all" | grep -vE 'Makefile|Kconfig' | xargs grep -n "$tab" > $wrong
check 'tabs'
echo "$all" | xargs grep -nE '[[:space:]]$' > $wrong
check 'blanks at the end of a line'
for f in $all; do [ -z "$(tail -c 1 "$f")" ] || echo "$f"; done > $wrong
check 'no newline at the end'
echo "$all" | grep -v '^tests/style/style.sh$' | xargs grep -nE 'TODO|FIXME|XXX' > $wrong
check 'unfinished'

for f in $(echo "$all" | grep -E '[.]([ch]|ino|sh|py|awk)$|Makefile$|run$'); do
    head -n 2 "$f" | grep -q 'SPDX-License-Identifier: MIT' || echo "$f"
done > $wrong
check 'no SPDX tag in the first two lines'

for f in $code; do functions "$f"; done > build/style.functions
awk '$4 > 60 && !$6 { print $1 ":" $2, $3, $4 " lines" }' build/style.functions > $wrong
check 'more than 60 lines, and no Long: and reason above'
awk '$1 == "roln.h" && $5 > 8 && $3 !~ /^rolni?_(ocp|riccati|polic|dare)/ { print $1 ":" $2, $3, $5 " parameters" }' \
    build/style.functions > $wrong
check 'more than 8 parameters of a function of models'
awk '$1 ~ /^roln_/ && $5 > 10 { print $1 ":" $2, $3, $5 " parameters" }' build/style.functions > $wrong
check 'more than 10 parameters'

# clang-format would align the comments of tables anew and set tables in columns of its own, so that a file may differ from what it
# makes in 10 lines and an eighth of its own; tables alone are left out. Other versions than 14 have other opinions.
if clang-format --version 2> /dev/null | grep -q 'version 14[.]'; then
    for f in $(echo "$code" | grep -vE '^tests/experiments/(recipes[.]|configs[.]h)'); do
        clang-format "$f" | diff "$f" - | awk -v f="$f" -v lines="$(wc -l < "$f")" '/^</ { n++ }
            END { if (n > 10 + lines / 8) print f ": " n " of " lines " lines are not as .clang-format has them" }'
    done > $wrong
    check 'layout'
else
    echo 'no clang-format 14: layout is not checked'
fi

# a bound names the test that holds it, FILE.c: FUNCTION: both are there
for f in $headers docs/*.md CONTRIBUTING.md; do
    tr '\n' ' ' < "$f" | tr -s ' ' | grep -oE '[a-z][a-z_0-9]*[.]c: [a-z][a-z_0-9]*' | sort -u | while read -r file name; do
        path=$(find tests -name "${file%:}")
        case $path$file in test_*) echo "$f: there is no ${file%:}" ;; esac
        [ -z "$path" ] || grep -qE "[^a-z_0-9]$name\(" $path || echo "$f: there is no $name in ${file%:}"
    done
done > $wrong
check 'tests that are not there'

# a user's macros must not meet ours: each of ours, and each word in capitals of two letters or more, begins with ROLN
for h in $headers; do
    awk -f "$style/strip.awk" "$h" | awk -v h="$h" -v foreign="^($foreign)\$" '
        /^ *# *define / { split($0, word, / *define +|[ (]/); if (word[2] !~ /^ROLN/) print h ":" NR, word[2] }
        { gsub(/0[xX][0-9A-Fa-f]+|[0-9.]+[eE][-+]?[0-9]+/, "0")
          n = split($0, word, /[^A-Za-z0-9_]+/)
          for (i = 1; i <= n; i++)
              if (word[i] ~ /^[A-Z][A-Z0-9_]*[A-Z][A-Z0-9_]*$/ && word[i] !~ /^ROLN/ && word[i] !~ foreign)
                  print h ":" NR, word[i] }'
done | sort -u > $wrong
check 'names that do not begin with ROLN'
set --
for d in PART TERMS DRAWS SIZE TYPE PI EPS MAX MIN DIM NAME WORK OK; do set -- "$@" -D$d=1; done
for cc in 'gcc -std=c99 -xc' 'g++ -std=c++11 -xc++'; do
    $cc "$@" -I. -Wall -Wextra -Werror -fsyntax-only tests/compilers/models.h 2> $wrong
    check "macros of a user, $cc"
done

# what a compiler, a debugger and a reader of messages get to see
for cc in gcc clang; do
    $cc -std=c99 -I. -E -xc examples/chain.h | awk -v cc=$cc 'length($0) > most { most = length($0); line = substr($0, 1, 60) }
        END { if (most >= 5000 || NR < 1000) print cc ": " most + 0 " characters: " line " .., of " NR " lines" }'
done > $wrong
check 'a line of 5,000 characters behind the preprocessor'

python3 tests/style/status.py > $wrong
check 'statuses that comments do not tell'

# the programs above see what they are for
cat > build/style.c << 'END'
/* not "this, but
   that" */
static double one(double (*f)(int, int), const char *s)
{
    return s[0] == '"' ? f(1, 2) : '}';
}

/* Two. Long: an
   example. */
#define BRACES { {
void NAME(two)(void)
{
}
int three(int a,
          int b, int c) { return a + b + c; } // "
END
printf '%s\n' 'build/style.c 3 one 4 2 0' 'build/style.c 11 NAME(two) 3 0 1' 'build/style.c 14 three 2 3 0' > build/style.want
functions build/style.c | diff - build/style.want > $wrong
check 'functions are not seen'
for h in $headers; do awk -v h="$h" '$1 == h { n++ } END { if (n < 20) print h, n + 0 }' build/style.functions; done > $wrong
check 'hardly any functions are seen'

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
