#!/bin/sh
# SPDX-License-Identifier: MIT
# What the kernels cost on a Cortex-M4F at -O2, in instructions counted by QEMU: count.c with contraction (-ffp-contract=fast)
# beside the build that gives the same bits everywhere. A mean above its target fails, and without contraction above 1.45 times
# the target.
cd "$(dirname "$0")/../.." || exit 1
out=build/firmware/m4/tests/measure
mkdir -p $out
for c in fast off; do
    sh examples/firmware/cc.sh m4 -ffp-contract=$c tests/measure/count.c -o $out/count_$c.elf &&
        sh examples/firmware/run.sh m4 $out/count_$c.elf > $out/count_$c.txt || { cat $out/count_$c.txt; exit 1; }
done
paste $out/count_fast.txt $out/count_off.txt | awk -F '\t' '
    BEGIN { print "Cortex-M4F -O2, instructions, not cycles      mean       most     target    no contraction" }
    { bad = $2 > $4 || $6 > 1.45 * $4; failed += bad
      printf "%-45s %10.10g %10.10g %10.10g %10.10g x %.2f%s\n", $1, $2, $3, $4, $6, $6 / $2, bad ? "  above" : "" }
    END { printf "%d passed, %d failed\n", NR - failed, failed; exit failed > 0 }'
