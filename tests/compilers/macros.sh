#!/bin/sh
# SPDX-License-Identifier: MIT
# macros.sh - no identifier of the headers meets a macro of a system header. macros.txt holds the names, without those that
# cannot be ours: in capitals (tests/style/style.sh: ours begin with ROLN), in camelCase, longer than 12 letters, with a _ in front.
# Those that are words of the headers are defined as nonsense before the include: name as an object, name() as a function.
#
#   macros.sh              the test
#   macros.sh gather DIR.. prints such names of the headers below DIR; macros.txt says of which packages its lines are
cd "$(dirname "$0")/../.." || exit 1
export LC_ALL=C
if [ "$1" = gather ]; then
    shift
    find "$@" -type f \( -name '*.h' -o -name '*.hpp' -o -name '*.H' -o ! -name '*.*' \) -exec \
        grep -ahoE '^[[:space:]]*#[[:space:]]*define[[:space:]]+[A-Za-z][A-Za-z0-9_]*[(]?' {} + |
        sed 's/.*define[[:space:]]*//; s/($/()/' |
        grep -xE '([a-z][a-z0-9_]{0,11}|[A-Z][a-z0-9]?[0-9]?)([(][)])?' | sort -u | tr '\n' ' ' | fold -s -w 130 | sed 's/ *$//'
    echo
    exit
fi
mkdir -p build
passed=0
failed=0
headers='roln_spd.h roln_ae.h roln_lnn.h roln_riem.h roln.h'
for h in $headers; do awk -f tests/style/strip.awk $h; done | grep -oE '[A-Za-z_][A-Za-z0-9_]*' | sort -u > build/macros.words
# what the language or the headers take from outside: a macro of that name is the thing itself, in other words
own='fabsf?|sqrtf?|floor|mem(cpy|move|set)|char|const|int|inline|unsigned|void|volatile|for|if|else|while|double|static|return'
# macros of R and glibc that give a name another one, in the headers and in the program alike
renamed='beta|dt|error|eval|sign|time'
grep -v '^#' tests/compilers/macros.txt | tr ' ' '\n' | sort -u > build/macros.names
while read -r name; do
    word=${name%()}
    grep -qxF "$word" build/macros.words || continue
    echo "$word" | grep -qxE "$own|$renamed" && continue
    [ "$word" = "$name" ] && echo "#define $word @" || echo "#define $word(...) @"
done < build/macros.names > build/macros.h
check() {
    if "$@" > build/macros.log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $*"
        grep -E 'error|note: .*macro' build/macros.log | head -n 20
    fi
}
for type in '' -DROLN_DOUBLE -DROLN_SIMD=0; do
    for cc in 'gcc -std=c99 -xc' 'g++ -std=c++11 -xc++' 'clang -std=c99 -xc' 'clang++ -std=c++11 -xc++'; do
        printf '#include <math.h>\n#include <stddef.h>\n#include <stdint.h>\n#include <string.h>\n#include "%s"\n' \
            macros.h ../tests/compilers/models.h > build/macros.c
        check $cc $type -I. -fsyntax-only build/macros.c
    done
done
# they are looked for: the list has what is known to hurt, and a name that the headers have is found
for name in near far small columns 'read()' 'sq()' 'F()' A1 D1 emit 'K()' 'word()'; do
    check grep -qxF "$name" build/macros.names
done
check grep -qx '#define sq(...) @' build/macros.h
echo '#define alike @' | cat - build/macros.c > build/macros_red.c
check sh -c '! gcc -std=c99 -I. -fsyntax-only build/macros_red.c'
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
