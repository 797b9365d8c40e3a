#!/bin/sh
# SPDX-License-Identifier: MIT
# Line coverage of the five headers by the unit tests, float with vector kernels and double with plain ones together: at least
# 98 % of each; a header of which gcov saw nothing has failed.
cd "$(dirname "$0")/../.." || exit 1
make -s build/test_cov || exit 1
find build/cov32 build/cov64 -name '*.gcda' -exec rm {} +
build/test_cov sample > build/test_cov.log || { tail -n 20 build/test_cov.log; exit 1; }
gcov -t build/cov*/tests/unit/*.gcda 2> /dev/null | awk -F: -v headers="$(ls roln*.h | wc -l)" '
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
