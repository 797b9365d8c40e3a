#!/bin/sh
# SPDX-License-Identifier: MIT
# cc.sh - build an image for a core:  sh cc.sh m4 [options] file.c .. -o file.elf      cores: m4 m7 m33 m55 rv32 host
# Single precision only, so that a double by mistake shows as a library call. The vectors of the M55 (Helium, MVE) take denormal
# numbers for 0. roln's kernels for them look for such numbers and have the same bits as elsewhere. Vectors that the compiler makes
# of other loops do not look: -fno-tree-vectorize. The assembler of binutils 2.40 takes a conversion under the condition ne for
# another instruction: -fno-if-conversion2.
here=$(dirname "$0")
core=$1
shift
arm='arm-none-eabi-gcc -mthumb -mfloat-abi=hard'
riscv='riscv64-unknown-elf-gcc -march=rv32imfc -mabi=ilp32f -mcmodel=medany --specs=picolibc.specs'
case $core in
m4) cc="$arm -mcpu=cortex-m4" board=an386 ;;
m7) cc="$arm -mcpu=cortex-m7+nofp.dp" board=an500 ;;
m33) cc="$arm -mcpu=cortex-m33" board=an505 ;;
m55) cc="$arm -march=armv8.1-m.main+dsp+mve.fp -mtune=cortex-m55 -fno-tree-vectorize -fno-if-conversion2" board=an547 ;;
rv32) cc=$riscv board=virt ;;
host) cc=${CC:-cc} board= ;;
*) echo "cc.sh: no core $core" >&2; exit 1 ;;
esac
case $core in
host) files=host.c ;;
rv32) files='start_riscv.c uart_16550.c emulator.c' ;;
*) files='start_arm.c uart_cmsdk.c emulator.c' ;;
esac
sources=
for f in $files; do sources="$sources $here/$f"; done
flags="-std=c99 -O2 -ffp-contract=off -fno-math-errno -I$here -I$here/.. -I$here/../.."
if [ -z "$board" ]; then exec $cc $flags $sources "$@" -lm; fi
exec $cc $flags -ffunction-sections -fdata-sections -nostdlib -Wl,--gc-sections -T "$here/$board.ld" -T "$here/sections.ld" \
    $sources "$@" -lc -lgcc
