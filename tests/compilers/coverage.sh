#!/bin/sh
# Line coverage of the five headers by the unit tests, float with vector kernels and double with plain ones together: at least
# 98 % of each; a header of which gcov saw nothing has failed.
cd "$(dirname "$0")/../.." || exit 1
dir=build/coverage
rm -rf $dir
mkdir -p $dir
cd $dir || exit 1
flags='-std=c99 -O0 --coverage -ffp-contract=off -I../..'
for f in dense eig spd ae lnn riem roln control; do
    gcc $flags -c ../../tests/unit/test_$f.c -o ${f}_f32.o && gcc $flags -DROLN_DOUBLE -DROLN_SIMD=0 -c ../../tests/unit/test_$f.c -o ${f}_f64.o || exit 1
done
# the exhaustive test of the elementary functions is too slow without optimisation; its double half covers section 4
gcc $flags -DROLN_DOUBLE -c ../../tests/unit/test_elementary.c -o elementary_f64.o || exit 1
gcc -std=c99 -DSKIP_ELEMENTARY_F32 -c ../../tests/unit/main.c ../../tests/unit/check.c || exit 1
gcc --coverage ./*.o -o test -lm && ./test > test.log || { tail -n 20 test.log; exit 1; }
gcov -t ./*.gcda 2> /dev/null | awk -F: -v headers="$(ls ../../roln*.h | wc -l)" '
    $3 == "Source" { n = split($4, path, "/"); file = path[n]; next }
    file !~ /^roln/ { next }
    { count = $1; gsub(/[ *]/, "", count) }
    count == "-" || count == "" { next }
    { key = file ":" ($2 + 0); seen[key] = 1; if (count !~ /^[#=]/) hit[key] = 1 }
    END {
        for (k in seen) { split(k, p, ":"); total[p[1]]++; if (k in hit) run[p[1]]++; else missed[p[1]] = missed[p[1]] " " p[2] }
        for (f in total) {
            printf "%-12s %5.1f %% of %d lines; not run:%s\n", f, 100 * run[f] / total[f], total[f], missed[f]
            if (run[f] >= 0.98 * total[f]) passed++; else failed++
        }
        unseen = headers - passed - failed
        if (unseen != 0) { printf "%d headers, seen %d\n", headers, passed + failed; failed += unseen > 0 ? unseen : 1 }
        printf "%d passed, %d failed\n", passed, failed
        exit failed > 0
    }'
