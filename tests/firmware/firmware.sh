#!/bin/sh
# SPDX-License-Identifier: MIT
# The images of examples/firmware on every core, in QEMU: they print what the same program prints on this machine (but for lines on
# instructions), they do what they claim, and they hold nothing from outside but mem*, chart beside that double in software; the
# instruction counter is exact; kernels for Helium have the bits of plain C; faults end safely; adaptation survives resets, a save
# survives one at any instruction, and a power cut at every write and in the middle of every word.
cd "$(dirname "$0")/../.." || exit 1
fw=examples/firmware
out=build/firmware
own='board_[a-z]+|start|start_memory|fault|fault_report|trap|trap_report|systick|main'
allowed='mem(cpy|set|cmp|move)|__aeabi_u?ldivmod|__[al]sh[lr]di3'
double='__aeabi_[a-z0-9]*d[a-z0-9]*|__[a-z]+df[23]?|__truncdfsf2|__clz[a-z_2]+' # of chart alone
warn='-Wall -Wextra -Wconversion -Wdouble-promotion -Wshadow -Werror'
passed=0
failed=0
# check text command ..
check() {
    text=$1
    shift
    if "$@" > $out/check.log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$text"
        head -n 20 $out/check.log
    fi
}
# run core image: its output in image.txt, its exit code at the end
run() {
    timeout 300 sh $fw/run.sh "$1" "$2" > "$2.txt" 2>&1
    echo "exit $?" >> "$2.txt"
}
# build core name file .. options: a test image
build() {
    core=$1
    image=$out/$1/$2.elf
    shift 2
    check "$image does not build" sh $fw/cc.sh "$core" $warn "$@" -o "$image"
    run "$core" "$image"
}
same() { grep -v '^instructions' "$1" | diff - "$2"; }
prints() { grep -E "$1" "$2" || { cat "$2"; false; }; }

make -s firmware || { echo '0 passed, 1 failed'; exit 1; }
host=$out/host/$fw
for p in predict three control chart adapt plan; do
    run host $host/$p.elf
    grep -v '^instructions' $host/$p.elf.txt > $host/$p.txt
    check "$p fails on the host" prints '^exit 0$' $host/$p.txt
done
# error rows of adapt: of the trained model on its machine; of the adapting one on the changed machine, at first and at last
back='/^trained/ { a = $2; b = $3 } /^tick/ && $2 == 0 { first = $4 } $2 == 4000 { x = $3; y = $4 }
    END { exit !(first > 3 * b && x > 0 && y > 0 && x <= 1.5 * a && y <= 2.5 * b && y <= first / 12) }'
check 'adapt: not within 1.5 (250 ms) and 2.5 (1 s) of the trained model, or less than 12 times better' awk "$back" $host/adapt.txt
build host rods tests/firmware/rods.c
check 'rods.h does not move as chain_plant.h' prints '^exit 0$' $out/host/rods.elf.txt
# -fsanitize=thread calls a function before every store: not that library's, which would be linked with the same option
check 'cuts.c does not build' sh -c "${CC:-cc} -std=c99 -O1 $warn -ffp-contract=off -fno-math-errno -fsanitize=thread \
    -I$fw -Iexamples -I. -c tests/firmware/cuts.c -o $out/host/cuts.o && sh $fw/cc.sh host $out/host/cuts.o -o $out/host/cuts.elf"
run host $out/host/cuts.elf
check 'a power cut loses a save' prints '^exit 0$' $out/host/cuts.elf.txt
check 'chart: 40 samples are not refused' prints '^ +40 .* refused$' $host/chart.txt
check 'chart: not ten times better than the linear one' \
    awk '$1 == 0 { first = $2 } $1 == 4000 && NF == 2 { last = $2 } END { exit !(last > 0 && last < first / 10) }' $host/chart.txt
check 'control: does not arrive' awk '$1 == 140 && $2 < 0.05 && $5 == 0 { ok = 1 } END { exit !ok }' $host/control.txt
check 'control: a bad tick is not bridged' awk '$1 == 60 && $5 == 3 && $3 != 0 { ok = 1 } END { exit !ok }' $host/control.txt
check 'control: a dead encoder does not stop the motors' \
    awk '$1 == 165 && $5 == 67 && $3 == 0 && $4 == 0 { ok = 1 } END { exit !ok }' $host/control.txt

for core in m4 m7 m33 m55 rv32; do
    for p in predict three control chart adapt plan serial furuta arm; do
        image=$out/$core/$fw/$p.elf
        if [ $p != serial ] && [ $p != furuta ] && [ $p != arm ]; then # which answer only (tests/control)
            run $core $image
            check "$core $p: not what the host prints" same $image.txt $host/$p.txt
        fi
        # all functions that are not of this directory: soft double, libm and the heap are not among the few allowed
        case $p in chart | adapt) more="|$double" ;; *) more= ;; esac # sums over recordings
        found=$(arm-none-eabi-nm -g --defined-only $image | awk '$2 ~ /^[TtWw]$/ { print $3 }' | grep -vxE "$own|$allowed$more")
        check "$core $p: holds $found" [ -z "$found" ]
    done

    build $core count tests/firmware/count.c
    check "$core: the instruction counter is wrong" prints '^exit 0$' $out/$core/count.elf.txt

    if [ $core = m55 ]; then
        for level in -O2 -O3; do
            build $core bits$level $level -Iexamples tests/firmware/bits.c tests/firmware/bits_plain.c
            check "$core $level: Helium and plain C have other bits" prints '^exit 0$' $out/$core/bits$level.elf.txt
        done
    fi

    build $core resets $fw/adapt.c tests/firmware/resets.c -Wl,--wrap=board_count
    log=$out/$core/resets.elf.txt
    check "$core: another hash after resets" [ "$(grep '^hash' $log)" = "$(grep '^hash' $host/adapt.txt)" ]
    check "$core: hardly any resets" [ "$(grep -c '^resumed at tick [1-9]' $log)" -ge 20 ]
    check "$core: started anew" [ "$(grep -c '^start' $log)" -eq 1 ]

    for f in 1 2 3; do
        [ $core$f = rv323 ] && continue # what lies below the stack is memory there, too
        build $core fault$f -DFAULT=$f tests/firmware/fault.c
        check "$core: fault $f" prints '^fault [0-9]+( at 0x[0-9a-f]+)?$' $out/$core/fault$f.elf.txt
        check "$core: fault $f: motors" prints '^motors off$' $out/$core/fault$f.elf.txt
        check "$core: fault $f: exit" prints '^exit 255$' $out/$core/fault$f.elf.txt
    done
    [ $core = rv32 ] && continue
    build $core torn tests/firmware/torn.c -Wl,--wrap=systick
    check "$core: a save torn by a reset" prints '^exit 0$' $out/$core/torn.elf.txt
done

# the directory alone with the headers, as a user copies it, and without emulator.c
rm -rf $out/copy
mkdir $out/copy
cp $fw/* examples/chain.h examples/chain_weights.h roln*.h $out/copy
sed -i 's/ emulator.c//' $out/copy/cc.sh
for core in m4 rv32; do
    check "$core: the copied directory" sh -c "cd $out/copy && sh cc.sh $core predict.c -o predict.elf"
done
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
