#!/bin/sh
# SPDX-License-Identifier: MIT
# deps.sh OPTION PACKAGE .. - installs the missing packages with apt-get OPTION, by sudo unless root. Some systems have packages
# that conflict with one of these (gcc-multilib with the cross compilers), and apt would remove them. Then deps.sh names them and
# ends, unless AGREE=yes.
export LC_ALL=C
option=$1
shift
sudo=
[ "$(id -u)" = 0 ] || sudo=sudo

get() {
    $sudo apt-get update -q || exit 1
    plan=$(apt-get install -s "$option" "$@" 2>&1) || { echo "$plan"; exit 1; }
    removed=$(echo "$plan" | sed -n 's/^Remv \([^ ]*\).*/\1/p' | tr '\n' ' ')
    if [ -n "$removed" ] && [ "$AGREE" != yes ]; then
        echo "apt would remove: $removed"
        echo "to install:       $*"
        echo 'Nothing is changed. If you agree: make deps AGREE=yes'
        exit 1
    fi
    keep=--no-remove
    [ -z "$removed" ] || keep=
    $sudo env DEBIAN_FRONTEND=noninteractive apt-get install -y -q "$option" $keep "$@" || exit 1
}

missing=
for p in "$@"; do
    dpkg-query -W -f='${Status}' "$p" 2> /dev/null | grep -q 'ok installed' || missing="$missing $p"
done
[ -z "$missing" ] || get $missing

# the sanitizers of clang are a package with clang's version in its name, or, on other systems, part of clang
dir=$(mktemp -d) || exit 1
trap 'rm -rf "$dir"' EXIT
echo 'int main(void) { return 0; }' > "$dir/try.c"
clang -fsanitize=memory "$dir/try.c" -o "$dir/try" > /dev/null 2>&1 || get "libclang-rt-$(clang -dumpversion | cut -d. -f1)-dev"
