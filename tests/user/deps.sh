#!/bin/sh
# SPDX-License-Identifier: MIT
# make deps with an apt-get that only writes down how it is called: it installs what is missing and no more, and where packages
# would be removed it names them and changes nothing, unless the user has agreed.
cd "$(dirname "$0")/../.." || exit 1
tmp=$(mktemp -d) || exit 1
trap 'rm -rf "$tmp"' EXIT
passed=0
failed=0

# apt-get: simulates what is in plan, with its exit code; dpkg-query: the packages in $tmp/here; clang: has sanitizers if told
cat > "$tmp/apt-get" << END
#!/bin/sh
echo "\$*" >> $tmp/calls
case "\$*" in *' -s '*) cat $tmp/plan; exit \$(cat $tmp/code) ;; esac
END
cat > "$tmp/dpkg-query" << END
#!/bin/sh
for p in "\$@"; do :; done
grep -qx "\$p" $tmp/here && echo 'install ok installed'
END
cat > "$tmp/clang" << END
#!/bin/sh
case \$1 in -dumpversion) echo 14.0.6 ;; *) [ -f $tmp/sanitizers ] ;; esac
END
printf '#!/bin/sh\nexec "$@"\n' > "$tmp/sudo"
chmod +x "$tmp"/*
export PATH="$tmp:$PATH"

# deps WANTED-CODE PACKAGES-HERE CODE-AND-PLAN-OF-APT [AGREE=yes]: make deps (or make $rest) with PACKAGES='one two three' and
# RELEASE_PACKAGES=four. Its output is in log.
deps() {
    want=$1
    echo "$2" | tr ' ' '\n' > "$tmp/here"
    echo "$3" | sed 's/;.*//' > "$tmp/code"
    echo "$3" | tr ';' '\n' | sed 1d > "$tmp/plan"
    : > "$tmp/calls"
    make -s ${rest:-deps} PACKAGES='one two three' RELEASE_PACKAGES=four $4 > "$tmp/log" 2>&1
    code=$?
    { [ "$want" = 0 ] && [ $code -eq 0 ]; } || { [ "$want" = 1 ] && [ $code -ne 0 ]; }
}
called() { grep -Eqx -e "$1" "$tmp/calls"; }
says() { grep -Eq -e "$1" "$tmp/log"; }
check() {
    if "$@"; then passed=$((passed + 1)); else failed=$((failed + 1)); echo "failed: $*"; cat "$tmp/calls" "$tmp/log"; fi
}
not() { ! "$@"; }

: > "$tmp/sanitizers"
check deps 0 'one two three' 0
check not called '.*'
check deps 0 'two' '0;Inst one;Inst three'
check called 'install -y -q --no-install-recommends --no-remove one three'
removal='0;Remv gcc-multilib [4:12];Remv gcc-12-multilib [12.2];Inst one'
check deps 1 'two three' "$removal"
check not called 'install -y.*'
check says '^apt would remove: gcc-multilib gcc-12-multilib $'
check says 'make deps AGREE=yes$'
check deps 1 'two three' "$removal" AGREE=no
check not called 'install -y.*'
check deps 0 'two three' "$removal" AGREE=yes
check called 'install -y -q --no-install-recommends one'
check deps 1 'two three' '100;E: Unable to locate package one' AGREE=yes
check not called 'install -y.*'
check says 'Unable to locate'

# make release-deps: those of make deps, then the others
rest=release-deps
check deps 0 'one two' '0;Inst three;Inst four'
check called 'install -y -q --no-install-recommends --no-remove three'
check called 'install -y -q --install-recommends --no-remove four'
rest=

# the sanitizers alone
rm "$tmp/sanitizers"
check deps 0 'one two three' '0;Inst libclang-rt-14-dev'
check called 'install -y -q --no-install-recommends --no-remove libclang-rt-14-dev'
check deps 1 'one two three' "$removal"
check not called 'install -y.*'

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
