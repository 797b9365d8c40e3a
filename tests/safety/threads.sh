#!/bin/sh
# SPDX-License-Identifier: MIT
# threads.sh - threads and interrupts on one constant model: threads.c under the thread sanitizer, interrupts.c.
# Last line: N passed, N failed.
cd "$(dirname "$0")/../.." || exit 1
for program in threads interrupts; do
    build/$program > build/$program.txt 2>&1 || echo "0 passed, 1 failed" >> build/$program.txt
    sed "s/^/$program: /" build/$program.txt | head -n 60
done
awk '/^[0-9]+ passed, [0-9]+ failed$/ { passed += $1; failed += $3 }
    END { print passed + 0 " passed, " failed + 0 " failed"; exit failed > 0 || passed == 0 }' \
    build/threads.txt build/interrupts.txt
