#!/bin/sh
# SPDX-License-Identifier: MIT
# list.sh - the list at the top of roln.h is what the shell generates: every function (as the compiler exports them with an empty
# ROLN_FN) and every type (as they are defined after preprocessing) of a model with full weights and of one with small ones, and
# nothing else. Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
mkdir -p build
dir=build/list
rm -rf $dir
mkdir -p $dir
passed=0
failed=0
check() { # check TEXT FILE: nothing is in FILE
    if [ -s "$2" ]; then failed=$((failed + 1)); echo "$1: $(tr '\n' ' ' < "$2")"; else passed=$((passed + 1)); fi
}

cat > $dir/models.c << 'END'
#define ROLN_NAME one
#define ROLN_AE 6, 4, 2
#define ROLN_CHART polynomial, 3
#define ROLN_MLP 4
#define ROLN_GN_ROWS 8
#define ROLN_FRICTION 2
#define ROLN_ACTUATOR current
#define ROLN_PLAN 3, 2
#define ROLN_DELAY 2
#include "roln.h"
#define ROLN_NAME two
#define ROLN_AE 6, 4, 2
#define ROLN_MLP 4
#define ROLN_QUANTISE int8
#include "roln.h"
END

# listed, one a line: types up to `Generated functions`, functions from there on
awk -v dir=$dir '
    /^   Generated types/ { to = dir "/types.listed" }
    /^   Generated functions/ { to = dir "/functions.listed" }
    /^   How this file is ordered/ { exit }
    to && match($0, /^       NAME_[a-z_]+ /) { print substr($0, RSTART + 12, RLENGTH - 13) > to }' roln.h

# NAME_i_.. promises nothing
${CC:-gcc} -std=c99 -I. -DROLN_FN= -O0 -c -o $dir/models.o $dir/models.c &&
    nm $dir/models.o | sed -n 's/^[0-9a-f]* T \(one\|two\)_//p' | grep -v '^i_' | sort -u > $dir/functions
${CC:-gcc} -std=c99 -I. -E -P $dir/models.c | grep -oE '\} *(one|two)_[a-z_]+ *;' |
    sed 's/.*\(one\|two\)_//; s/ *;//' | grep -v '^i_' | sort -u > $dir/all
# NAME_x_work stands for the scratch of every function x
sed 's/$/_work/' $dir/functions | sort | comm -13 - $dir/all > $dir/types
sed -i '/^x_work$/d' $dir/types.listed

for kind in functions types; do
    sort -u $dir/$kind.listed > $dir/$kind.sorted
    sort $dir/$kind.listed | uniq -d > $dir/wrong
    check "$kind listed twice" $dir/wrong
    comm -13 $dir/$kind $dir/$kind.sorted > $dir/wrong
    check "$kind listed, not generated" $dir/wrong
    comm -23 $dir/$kind $dir/$kind.sorted > $dir/wrong
    check "$kind generated, not listed" $dir/wrong
    # a list that was not found would be equal to nothing
    if [ "$(wc -l < $dir/$kind)" -ge 10 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "few $kind"; fi
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
