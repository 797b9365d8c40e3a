#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh - run an image in QEMU: its UART on standard input and output, its exit code:  sh run.sh m4 file.elf [options of QEMU]
# mux: a buffer before the UART, which takes one byte at a time; no byte (256) is an escape.
# One instruction takes 256 ns of the virtual clock (emulator.c), on RISC-V 1 ns, which counts instructions by itself.
core=$1
image=$2
shift 2
case $core in
m4) qemu='qemu-system-arm -M mps2-an386' ;;
m7) qemu='qemu-system-arm -M mps2-an500' ;;
m33) qemu='qemu-system-arm -M mps2-an505' ;;
m55) qemu='qemu-system-arm -M mps3-an547' ;;
rv32) qemu='qemu-system-riscv32 -M virt -bios none' ;;
host) case $image in /*) exec "$image" ;; *) exec "./$image" ;; esac ;;
*) echo "run.sh: no core $core" >&2; exit 1 ;;
esac
shift=8
[ "$core" = rv32 ] && shift=0
exec $qemu -icount shift=$shift -display none -monitor none -chardev stdio,id=uart,mux=on -serial chardev:uart -echr 256 \
    -semihosting-config enable=on,target=native -kernel "$image" "$@"
