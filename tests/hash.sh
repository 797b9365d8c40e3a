#!/bin/sh
# The same bits from every compiler, level, target and kernel: builds tests/hash.c in each way and compares its line with
# tests/hash.txt. Prints what differs; last line: N passed, N failed. JOBS=1 for one core; hash.sh -w writes hash.txt.
cd "$(dirname "$0")" || exit 1
tmp=$(mktemp -d) || exit 1
trap 'rm -rf "$tmp"' EXIT
if [ "$1" = -w ]; then
    for d in "" -DROLN_DOUBLE; do gcc -std=c99 -O1 -ffp-contract=off $d hash.c -lm -o "$tmp/w" && "$tmp/w"; done > hash.txt
fi
one='name=$(echo "$0" | tr -c "[:alnum:]\n" _); case $0 in *DOUBLE*) p=double;; *) p=float;; esac
got=$($0 -std=c99 -ffp-contract=off hash.c -lm -o '"$tmp"'/$name 2>&1 && '"$tmp"'/$name 2>&1); rm -f '"$tmp"'/$name
if [ -n "$got" ] && [ "$got" = "$(grep "^$p " hash.txt)" ]; then echo ok; else echo "$0: $got" | head -3 | tr "\n" " "; echo; fi'
for cc in ${HASH_CC:-gcc clang}; do
    for level in -O3 -O2 -O1 -Os -O0; do
        for native in "" " -march=native"; do
            for type in "" " -DROLN_DOUBLE"; do
                echo "$cc $level$native$type"
                # the scalar kernels where compilers vectorise by themselves, and where they do nothing
                case $level in -O2 | -O0) echo "$cc $level$native$type -DROLN_SIMD=0" ;; esac
            done
        done
    done
done | xargs -P "${JOBS:-$(nproc)}" -I{} sh -c "$one" {} > "$tmp/all"
grep -v '^ok$' "$tmp/all"
failed=$(grep -vc '^ok$' "$tmp/all")
echo "$(grep -c '^ok$' "$tmp/all") passed, $failed failed"
[ "$failed" -eq 0 ] && [ -s "$tmp/all" ]
