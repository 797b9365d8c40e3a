#!/bin/sh
# SPDX-License-Identifier: MIT
# hash.sh - the same bits everywhere: builds hash.c for each line `target compiler options`, runs it, in QEMU if need be, and
# compares: the packed parameters that it writes with those that gcc's program on this machine writes, its lines with hash.txt. Each
# program goes on with the parameters from this machine. Prints what differs; last line: N passed, N failed.
#
#   hash.sh host                this machine: every compiler, level, kernel
#   hash.sh targets             the others: the table below
#   hash.sh test host|targets   a part of these: every sixth; every third, all targets but s390x, m33 and m55
#   hash.sh test few            gcc and clang here, and an image on a Cortex-M4F
#   hash.sh armv7 gcc -O3       one line
#   hash.sh -w                  writes hash.txt
#
# JOBS=1 for one core. FLT_EVAL_METHOD must be 0: on s390x under -std=c99 gcc computes float in double unless it is told
# -fexcess-precision=fast, and i386 has x87 without -mfpmath=sse. The vectors of armv7, of ppc64 without VSX and of the M55 take
# denormal numbers for 0. roln makes those of the M55 alone, and looks for denormal numbers. A compiler makes others, and does not
# look, unless told not to: clang from -O2 on; cc.sh tells gcc for the M55.
cd "$(dirname "$0")/../.." || exit 1
here=tests/compilers
board=examples/firmware
flags='-std=c99 -ffp-contract=off -I.'

host() {
    for cc in gcc clang; do
        for level in -O3 -O2 -O1 -Os -O0; do
            for native in "" " -march=native"; do
                for type in "" " -DROLN_DOUBLE"; do
                    echo "host $cc $level$native$type"
                    # the scalar kernels where compilers vectorise by themselves, and where they do nothing
                    case $level in -O2 | -O0) echo "host $cc $level$native$type -DROLN_SIMD=0" ;; esac
                done
            done
        done
    done
    echo 'host tcc' # which optimises nothing and has no vectors
    echo 'host tcc -DROLN_DOUBLE'
}

targets() { # what takes longest first
    cat << '    end'
ppc64 gcc -O2 -mcpu=power8
ppc64 clang -Os -mcpu=power8 -DROLN_DOUBLE
s390x gcc -O2 -fexcess-precision=fast
s390x clang -Os -DROLN_DOUBLE
m4 gcc -O2
m4 clang -Os
m7 gcc -Os
m7 clang -O2
m33 gcc -O2
m7 gcc -O2 -mcpu=cortex-m7 -DROLN_DOUBLE
rv32 gcc -Os
m55 gcc -O2
aarch64 gcc -O2
aarch64 gcc -Os -DROLN_SIMD=0 -DROLN_DOUBLE
aarch64 clang -Os -DROLN_DOUBLE
aarch64 clang -O2 -DROLN_SIMD=0
armv7 gcc -O2
armv7 gcc -Os -DROLN_DOUBLE
armv7 clang -O2 -mfpu=vfpv3-d16 -DROLN_DOUBLE
armv7 clang -Os -mfpu=vfpv3-d16
armv7 clang -O1 -mfpu=neon
riscv64 gcc -O2
riscv64 gcc -Os -DROLN_DOUBLE
riscv64 clang -O2 -DROLN_DOUBLE
riscv64 clang -Os
i386 gcc -O2 -msse2 -mfpmath=sse
i386 gcc -Os -msse2 -mfpmath=sse -DROLN_DOUBLE
i386 clang -O2 -msse2 -DROLN_DOUBLE
i386 clang -Os -msse2
m55 gcc -Os -DROLN_SIMD=0
m55 clang -O2 -fno-vectorize -fno-slp-vectorize
    end
}

# directory, target, compiler, options: one line
one() {
    dir=$1 target=$2 compiler=$3
    shift 3
    core=
    case $target in
    host) triple=host run= ;;
    aarch64) triple=aarch64-linux-gnu run=qemu-aarch64 ;;
    armv7) triple=arm-linux-gnueabihf run=qemu-arm ;;
    i386) triple=i686-linux-gnu run=qemu-i386 ;;
    ppc64) triple=powerpc64-linux-gnu run='qemu-ppc64 -cpu power9' ;;
    riscv64) triple=riscv64-linux-gnu run=qemu-riscv64 ;;
    s390x) triple=s390x-linux-gnu run=qemu-s390x ;;
    *) triple=arm-none-eabi run="sh $board/run.sh $target" core="-mcpu=cortex-$target -mfloat-abi=hard" ;;
    esac
    case $triple in
    host) link="$compiler $flags $board/host.c" ;;
    *-linux-*) link="$triple-gcc -static $flags $board/host.c" include=/usr/$triple/include ;;
    *) link="sh $board/cc.sh $target" include=/usr/lib/arm-none-eabi/include ;;
    esac
    case "$*" in *DOUBLE*) real=double ;; *) real=float ;; esac
    it=$dir/$(echo "$target $compiler $*" | tr ' ' _)
    case $target/$compiler in
    host/* | */gcc) $link "$@" $here/hash.c -lm -o "$it" ;;
    *) $compiler --target=$triple $core -isystem $include $flags "$@" -c $here/hash.c -o "$it.o" && $link "$it.o" -lm -o "$it" ;;
    esac && timeout 600 $run "$it" < "$dir/$real.packed" > "$it.got" && cmp "$dir/$real.want" "$it.got" && rm "$it" && return
    tail -n 4 "$it.got" | grep -avxFf $here/hash.txt
    return 1
}

if [ "$1" = one ]; then
    shift
    one "$@"
    exit
fi

tmp=$(mktemp -d) || exit 1
trap 'rm -rf "$tmp"' EXIT
for real in float double; do # without input it ends when it has written its parameters
    gcc $flags -O1 $([ $real = float ] || echo -DROLN_DOUBLE) $here/hash.c $board/host.c -lm -o "$tmp/$real" &&
        "$tmp/$real" < /dev/null > "$tmp/$real.packed"
done
if [ "$1" = -w ]; then
    for real in float double; do "$tmp/$real" < "$tmp/$real.packed" | grep -a "^$real "; done > $here/hash.txt
    exit
fi
for real in float double; do { cat "$tmp/$real.packed"; echo; grep "^$real " $here/hash.txt; } > "$tmp/$real.want"; done

case "$*" in
host | targets) $1 ;;
'test host') host | awk 'NR % 6 == 3' ;;
'test targets') targets | awk 'NR % 3 == 2' ;;
'test few') printf '%s\n' 'm4 gcc -O2' 'host clang -O3 -DROLN_DOUBLE' 'host gcc -O2' ;;
*) echo "$*" ;;
esac | xargs -P "${JOBS:-$(nproc)}" -I{} sh -c \
    'if got=$(sh '$here'/hash.sh one '"$tmp"' {} 2>&1); then echo ok; else echo "{}:" $got; fi' > "$tmp/all"
grep -v '^ok$' "$tmp/all"
echo "figure: $(grep -c '^ok$' "$tmp/all") builds with the same bits"
failed=$(grep -vc '^ok$' "$tmp/all")
echo "$(grep -c '^ok$' "$tmp/all") passed, $failed failed"
[ "$failed" -eq 0 ] && [ -s "$tmp/all" ]
