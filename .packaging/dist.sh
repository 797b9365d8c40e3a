#!/bin/sh
# SPDX-License-Identifier: MIT
# dist.sh VERSION HEADER.. - build/dist: packages for PlatformIO, Arduino, Zephyr and ESP-IDF, each a directory and an archive of
# it: the files of its directory beside this script, the headers, LICENSE, the start of README, and tick as an example; and a bill
# of materials (SBOM) of these in SPDX 2.3. The same bytes on every run: names sorted, times of the last commit (or
# SOURCE_DATE_EPOCH), owner 0.
cd "$(dirname "$0")/.." || exit 1
set -e
umask 022
version=$1
shift
# without a git repository of its own: 1980, the first that zip knows; one further up knows nothing of roln
time=$([ "$(git rev-parse --show-toplevel 2> /dev/null)" = "$(pwd -P)" ] && git log -1 --format=%ct 2> /dev/null) || time=315532800
time=${SOURCE_DATE_EPOCH:-$time}
rm -rf build/dist

# package NAME, directory of the headers, tick.c or tick.ino, the path it gets, its entry point, HEADER..
package() {
    name=$1 include=$2 tick=$3 example=$4 entry=$5
    shift 5
    root=build/dist/$name/roln
    mkdir -p "$root/$include" "$root/$(dirname "$example")"
    for file in $(cd ".packaging/$name" && find . -type f); do
        mkdir -p "$root/$(dirname "$file")"
        sed "s/@VERSION@/$version/" ".packaging/$name/$file" > "$root/$file"
    done
    cp "$@" "$root/$include"
    cp LICENSE "$root"
    awk '/^!\[/ { off = 1 } /^## / { off = !/^## Use it from your build/ } !off' README.md > "$root/README.md"
    sed "s/@ENTRY@/$entry/" ".packaging/$tick" > "$root/$example"
    cp examples/chain.h examples/chain_weights.h "$root/$(dirname "$example")"
    find "$root" -type f -exec chmod 644 {} +
    find "$root" -exec touch -d "@$time" {} +
    cd "build/dist/$name"
    if [ "$name" = arduino ]; then # its IDE reads zip
        find roln | LC_ALL=C sort | TZ=UTC zip -q -X -9 -@ "../roln-$name-$version.zip"
    else
        find roln | LC_ALL=C sort | tar --no-recursion --format=ustar --owner=0 --group=0 --numeric-owner -c -T - |
            gzip -9 -n > "../roln-$name-$version.tar.gz"
    fi
    cd ../../..
}

package platformio src tick.ino examples/tick/src/main.cpp '' "$@"
package arduino src tick.ino examples/tick/tick.ino '' "$@"
package zephyr include tick.c samples/tick/src/main.c 'int main(void)' "$@"
package esp-idf include tick.c examples/tick/main/main.c 'void app_main(void)' "$@"
sh .packaging/sbom.sh "$version" "$time" LICENSE "$@" > "build/dist/roln-$version.spdx.json"
