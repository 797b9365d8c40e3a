#!/bin/sh
# SPDX-License-Identifier: MIT
# An object with every function kept takes nothing from outside but sqrt and mem*, and has no writable data (as in firmware,
# code at fixed addresses: the tables of verbs hold addresses of functions).
cd "$(dirname "$0")/../.." || exit 1
mkdir -p build
passed=0
failed=0
for type in '' -DROLN_DOUBLE; do
    for cc in gcc clang; do
        rm -f build/symbols.o
        if ! $cc -std=c99 -I. -xc -DROLN_FN= $type -O1 -fno-pie -fno-math-errno -c -o build/symbols.o \
            tests/compilers/models.h; then
            failed=$((failed + 1))
            echo "$cc $type: does not compile"
            continue
        fi
        outside=$(nm -u build/symbols.o | awk '{print $2}' | grep -vxE 'sqrtf?|memcpy|memset|memcmp|memmove|__stack_chk_fail')
        data=$(nm build/symbols.o | awk '$2 ~ /^[DdBbCGgSs]$/ {print $3}')
        for found in "$outside" "$data"; do
            if [ -z "$found" ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "$cc $type: $found"; fi
        done
        functions=$(nm build/symbols.o | grep -c ' T ')
        if [ "$functions" -ge 100 ]; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "only $functions functions"; fi
    done
done
# ROLN_CODE and ROLN_FLASH: with the model that the examples commit, code and weights lie where they are told to, no code elsewhere;
# so too under OWN, the ROLN_FN that roln_spd.h proposes
sed -n 's/^ *\(#define ROLN_FN .*inline\) .*/\1/p' roln_spd.h > build/own.h
cat > build/sections.c << 'END'
#ifdef OWN
#include "own.h"
#ifndef ROLN_FN
#error "no ROLN_FN"
#endif
#endif
#define ROLN_CODE __attribute__((section(".itcm")))
#define ROLN_FLASH __attribute__((section(".qspi")))
#include "examples/chain.h"
#include "examples/chain_weights.h"
#include "tests/compilers/models.h"
int tick(chain_state *x, chain_latent *s, chain_work *w, bytes_latent *z, bytes_state *y, const bytes_params *p, bytes_work *v);
ROLN_CODE
int tick(chain_state *x, chain_latent *s, chain_work *w, bytes_latent *z, bytes_state *y, const bytes_params *p, bytes_work *v)
{
    return chain_encode(&chain_weights, x, s, &w->encode) + chain_step(&chain_weights, s, NULL, 0.01f, &w->step) +
           bytes_decode(p, z, y, &v->decode) + bytes_encode(p, y, z, &v->encode);
}
END
for cc in 'gcc -O0' 'gcc -O2' 'clang -Os' 'clang -O0 -DOWN' 'gcc -Os -DOWN'; do
    rm -f build/sections.o
    $cc -std=c99 -I. -fno-math-errno -c -o build/sections.o build/sections.c
    outside=$(objdump -t build/sections.o | awk '/ F / && !/\.itcm/ { print $NF }')
    size=$(objdump -t build/sections.o | awk '/ chain_weights$/ && /\.qspi/ { print $(NF - 1) }')
    functions=$(objdump -t build/sections.o | grep -c ' F .*\.itcm')
    text=$(size -A build/sections.o | awk '$1 ~ /^\.text/ { n += $2 } END { print n + 0 }')
    if [ -z "$outside" ] && [ -n "$size" ] && [ "$functions" -ge 3 ] && [ "$text" -eq 0 ]; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$cc: outside .itcm: $outside ($text bytes of .text), $functions inside; weights in .qspi: $size"
    fi
done
# at -Og of gcc, which keeps the arguments, a debugger shows the scratch of a function by name
if command -v gdb > /dev/null; then
    cat > build/names.c << 'END'
#include "examples/chain.h"
#include "examples/chain_weights.h"
int main(void)
{
    static chain_work work;
    static chain_state x;
    static chain_latent s;
    static chain_target r;
    static chain_guard guard;
    const roln_limits limits = {.dt = 0.01f, .margin = 1, .tau = 1};
    const roln_status st = chain_encode(&chain_weights, &x, &s, &work.encode);
    return st != ROLN_OK || chain_tick(&chain_weights, &limits, &x, &r, &s, &guard, &work.tick) != 0;
}
END
    gcc -std=c99 -I. -Og -g -fno-math-errno build/names.c -o build/names -lm
    for words in 'chain_encode s tape' 'chain_tick encode rest decoded tau tau_z'; do
        function=${words%% *}
        gdb -q -batch -nx -ex "break $function" -ex run -ex 'print *w' build/names > build/names.log 2>&1
        for name in ${words#* }; do
            if grep -q "[{ ]$name = " build/names.log; then
                passed=$((passed + 1))
            else
                failed=$((failed + 1))
                echo "gdb shows no $name in the scratch of $function"
                tail -n 3 build/names.log | cut -c1-200
            fi
        done
    done
else
    echo 'no gdb: what it shows of scratch is not asked'
fi
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
