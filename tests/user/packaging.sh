#!/bin/sh
# SPDX-License-Identifier: MIT
# make install and make dist: one version number everywhere; programs outside the repository build against what is installed, with
# plain make, pkg-config and CMake; the packages hold what their systems ask for, their examples build and run on the PC with the
# stand-ins of tests/user/standin; the same bytes on every run. Each program is tick.c and prints the same line.
cd "$(dirname "$0")/../.." || exit 1
repo=$PWD
tmp=$(mktemp -d) || exit 1
trap 'rm -rf "$tmp"' EXIT
passed=0
failed=0
# check COMMAND ..: it must end with 0
check() {
    if "$@" > "$tmp/log" 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "failed: $*"
        tail -n 20 "$tmp/log"
    fi
}
not() { ! "$@"; }
same() { [ "$1" = "$2" ] || { echo "$1 is not $2"; false; }; }

# ---- versions ----

version=$(printf '#include "roln_spd.h"\nversion ROLN_VERSION\n' | cc -E -P -I. - | sed -n 's/^version "\(.*\)"$/\1/p')
numbers=$(printf '#include "roln_spd.h"\nversion ROLN_VERSION_MAJOR ROLN_VERSION_MINOR ROLN_VERSION_PATCH\n' | cc -E -P -I. - |
    sed -n 's/^version \([0-9]*\) \([0-9]*\) \([0-9]*\)$/\1.\2.\3/p')
check same "${version%-dev}" "$numbers"
# CHANGELOG: versions fall; the first is this one, or, with -dev, what is not released yet, and higher than all that was
check same "$(sed -n 's/^## //p' CHANGELOG.md | head -n 1)" "$(echo "$version" | sed 's/^\(.*\)-dev$/Unreleased: \1/')"
versions=$(sed -n 's/^## \(Unreleased: \)*//p' CHANGELOG.md)
check same "$versions" "$(echo "$versions" | grep -x '[0-9]*[.][0-9]*[.][0-9]*' | sort -Vru)"
series=$(echo "$version" | grep -Eo '^(0[.])?[0-9]+') # who asks for it gets this version
# a version as SemVer has it, which the registries of PlatformIO, Arduino and ESP-IDF take
check sh -c "echo '$version' | grep -Eqx '[0-9]+[.][0-9]+[.][0-9]+(-dev)?'"
# ROLN_FORMAT: the same number wherever it stands
format=$(sed -n 's/^#define ROLN_FORMAT //p' roln.h)
check grep -q "^FORMAT = $format " examples/import.py
check grep -q "Packed bytes have format $format;" CHANGELOG.md
for f in examples/*_weights.h; do check grep -q "_of_ROLN_FORMAT_$format\[.*_format == $format " "$f"; done
check grep -q "find_package(roln $series REQUIRED)" README.md

# the first of two runs of make dist, seconds apart
check make -s dist
sums() { (cd build/dist && find . -type f -exec cksum {} + | LC_ALL=C sort -k 3); }
sums > "$tmp/sums"

# ---- make install, and programs that use it ----

sed 's/@ENTRY@/int main(void)/' .packaging/tick.c > "$tmp/tick.c"
check cc -std=c99 -Wall -Wextra -Wpedantic -Werror -I. -Iexamples "$tmp/tick.c" -o "$tmp/here" -lm
"$tmp/here" > "$tmp/line"
check grep -Eq "^roln $version: status 0, mrad:( -?[0-9]{1,3}){8}\$" "$tmp/line"
# prints PROGRAM: it prints the same line first
prints() { "$@" | head -n 1 | cmp - "$tmp/line"; }

check make -s install PREFIX="$tmp/plain"
check make -s install DESTDIR="$tmp/stage dir" PREFIX="/opt/my roln"
check mv "$tmp/stage dir/opt/my roln" "$tmp/moved here" # both find their headers from where they lie
check rmdir "$tmp/stage dir/opt" "$tmp/stage dir"
for prefix in "$tmp/plain" "$tmp/moved here"; do
    check same "$(cd "$prefix" && find . -type f | LC_ALL=C sort | tr '\n' ' ')" "./include/roln.h ./include/roln_ae.h \
./include/roln_lnn.h ./include/roln_riem.h ./include/roln_spd.h ./share/cmake/roln/rolnConfig.cmake \
./share/cmake/roln/rolnConfigVersion.cmake ./share/pkgconfig/roln.pc "
    for f in roln*.h; do check cmp "$f" "$prefix/include/$f"; done
    export PKG_CONFIG_LIBDIR="$prefix/share/pkgconfig"
    check same "$version" "$(pkg-config --modversion roln)"
    for cc in gcc clang; do
        rm -rf "$tmp/consumer"
        cp -R tests/user/consumer "$tmp"
        cp "$tmp/tick.c" examples/chain.h examples/chain_weights.h "$tmp/consumer"
        cp "$tmp/tick.c" "$tmp/consumer/tick.cc"
        cd "$tmp/consumer" || exit 1
        check make -s CC=$cc PREFIX="$prefix"
        check sh -c "eval $cc -std=c99 tick.c -o line "'$(pkg-config --cflags --libs roln)' # eval: the blank in prefix
        check cmake -S . -B build -DROLN="$numbers" -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_C_COMPILER=$cc
        check cmake --build build
        for program in ./plain ./pkg ./line build/c build/cxx; do check prints $program; done
        cd "$repo" || exit 1
    done
done

# a program with names of roln 0.3 becomes one of today
sed -E -f .packaging/rename.sed tests/user/program_0.3.txt > "$tmp/renamed.c"
check gcc -std=c99 -Wall -Wextra -Werror -I. "$tmp/renamed.c" -o "$tmp/renamed" -lm
check same "$("$tmp/renamed")" '1 1'

# find_package: which versions a request gets
mkdir "$tmp/ask"
cat > "$tmp/ask/CMakeLists.txt" << 'END'
cmake_minimum_required(VERSION 3.16)
project(ask LANGUAGES NONE)
find_package(roln ${ROLN} QUIET)
message("found ${roln_FOUND}")
END
# serves YES-OR-NO VERSION-INSTALLED VERSION-ASKED ..: by the package in $tmp/plain under another number
serves() {
    f=share/cmake/roln/rolnConfigVersion.cmake
    sed "s/@NUMBERS@/$2/" ".packaging/$f" > "$tmp/plain/$f"
    rm -rf "$tmp/ask/build"
    cmake -S "$tmp/ask" -B "$tmp/ask/build" -DROLN="$3" -DCMAKE_PREFIX_PATH="$tmp/plain" \
        -DCMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF 2>&1 | grep -qx "found $1"
}
for asked in '' 0.3 0.3.0 0.3.4 '0.3.4;EXACT'; do check serves 1 0.3.4 "$asked"; done
for asked in 0 0.2 0.2.9 0.3.5 0.4 0.30 1 1.3 '0.3.3;EXACT'; do check serves 0 0.3.4 "$asked"; done
for asked in 2 2.1 2.1.5 2.0.9; do check serves 1 2.1.5 "$asked"; done
for asked in 0.2 1 1.9 2.1.6 2.2 3 21 2.1.5.1; do check serves 0 2.1.5 "$asked"; done
for asked in '2.1.5;EXACT' '2.1.5.0;EXACT' 02.01; do check serves 1 2.1.5 "$asked"; done
for asked in '2;EXACT' '2.1;EXACT' '2.1.4;EXACT'; do check serves 0 2.1.5 "$asked"; done
check serves 1 0.30.1 0.30
for asked in 0.3 0.3.0 0; do check serves 0 0.30.1 "$asked"; done
check serves 0 10.2.0 1
# ranges: from the lower end, of this series, to the upper end, which counts or, behind <, does not
for asked in 0.3...0.3.9 0.3...0.4 '0.3...<0.4' 0.3.9...0.3.9 0.3.0...1 '0.3.9...<0.3.10'; do check serves 1 0.3.9 "$asked"; done
for asked in 0.3...0.3.5 '0.3...<0.3.9' 0.3.1...0.3.8 0.2...0.4 0...1 0.3.10...0.4 '0.4...<1'; do
    check serves 0 0.3.9 "$asked"
done
for asked in 2.0...2.1.5 2...3 '2...<3' 2.1...2.2; do check serves 1 2.1.5 "$asked"; done
for asked in 2.0...2.1 '2...<2.1' '2...<2.1.5' 1...3 3...4; do check serves 0 2.1.5 "$asked"; done
# components: there are none; one that must be there is refused, one that may be is not found; twice in one project is once
serves 1 0.3.4 '' || failed=$((failed + 1))
cat > "$tmp/ask/CMakeLists.txt" << 'END'
cmake_minimum_required(VERSION 3.16)
project(ask LANGUAGES ${LANGUAGE})
function(ask)
    find_package(roln ${ARGN} QUIET)
    message("${ARGN}: ${roln_FOUND} ${roln_VERSION} [${roln_NOT_FOUND_MESSAGE}] [${roln_x_FOUND}]")
endfunction()
ask(COMPONENTS x)
ask(OPTIONAL_COMPONENTS x)
ask(0.3)
ask(0.3.4 EXACT)
set(CMAKE_VERSION 3.7)
ask(0.3)
END
cat > "$tmp/want" << 'END'
COMPONENTS;x: 0 0.3.4 [roln has no component x, nor any other] [FALSE]
OPTIONAL_COMPONENTS;x: 1 0.3.4 [] [FALSE]
0.3: 1 0.3.4 [] []
0.3.4;EXACT: 1 0.3.4 [] []
0.3: 0 0.3.4 [roln needs CMake 3.8 or later] []
END
for language in NONE C CXX; do
    rm -rf "$tmp/ask/build"
    cmake -S "$tmp/ask" -B "$tmp/ask/build" -DLANGUAGE=$language -DCMAKE_PREFIX_PATH="$tmp/plain" 2>&1 | grep '\[' > "$tmp/got"
    check diff "$tmp/got" "$tmp/want"
done
# pkg-config: from where the file lies, also if told so; versions; of a root of another system
export PKG_CONFIG_LIBDIR="$tmp/moved here/share/pkgconfig"
check sh -c "pkg-config --atleast-version=$numbers roln && pkg-config --exists 'roln >= $numbers' 'roln < 99'"
check same "$(eval set -- "$(pkg-config --cflags roln)"; cd "${1#-I}" && pwd)" "$tmp/moved here/include"
check same "$(eval set -- "$(pkg-config --define-prefix --cflags roln)"; cd "${1#-I}" && pwd)" "$tmp/moved here/include"

# make install under any umask, over files and links of any kind: what all may read, and nothing beside it
for mask in 077 000 027; do
    to="$tmp/mask $mask"
    for time in first again; do
        check sh -c "umask $mask && make -s install DESTDIR='$to' PREFIX='/usr/my local'"
        check same "$(find "$to" -mindepth 1 -type d ! -perm 755; find "$to" -type f ! -perm 644)" ""
        chmod 400 "$to/usr/my local/include/"*.h
        ln -sf /dev/full "$to/usr/my local/share/pkgconfig/roln.pc"
        chmod 600 "$to/usr/my local/share/cmake/roln/"*
    done
done

# a checkout as git makes it on Windows, in a directory with blanks and an umlaut: files of text have LF, make and scripts run
if [ -e .git ]; then
    clone="$tmp/über alles/my roln"
    check git clone -q -c core.autocrlf=true -c core.eol=crlf . "$clone"
    check same "$(cd "$clone" && git ls-files --eol | grep -v 'w/lf\|w/-text\|w/none')" ""
    check same "$(cd "$clone" && git ls-files --eol '*.roln' 'tests/safety/corpus' | grep -v 'attr/-text')" ""
    check same "$(cd "$clone" && git status --short)" ""
    check sh -c "cd '$clone' && make -s CONFIG=examples/arm.h lint install build/swelling DESTDIR='$tmp/from clone' &&
        make -s dist && build/swelling build/swelling.svg"
fi

# ---- make dist ----

check same 4 "$(grep -c '/roln-[a-z-]*-'"$version"'[.][a-z.]*$' "$tmp/sums")"
check same 1 "$(grep -c "/roln-$version[.]spdx[.]json\$" "$tmp/sums")"
chmod 600 examples/chain.h roln_ae.h .packaging/tick.c
check sh -c 'umask 077 && TZ=Asia/Tokyo make -s dist'
chmod 644 examples/chain.h roln_ae.h .packaging/tick.c
sums > "$tmp/again"
check cmp "$tmp/sums" "$tmp/again"
# the bill of materials: what it says of files, archives and the whole is so; no package beside roln's own
cat > "$tmp/sbom.py" << 'END'
import glob, hashlib, json, re, sys
version = sys.argv[1]
sums = {"SHA1": hashlib.sha1, "SHA256": hashlib.sha256}
sbom = json.load(open(f"build/dist/roln-{version}.spdx.json"))
def true(of, path):
    data = open(path, "rb").read()
    assert of["checksums"] and all(sums[c["algorithm"]](data).hexdigest() == c["checksumValue"] for c in of["checksums"]), path
assert sbom["spdxVersion"] == "SPDX-2.3" and sbom["dataLicense"] == "CC0-1.0" and sbom["SPDXID"] == "SPDXRef-DOCUMENT"
assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", sbom["creationInfo"]["created"])
roln, *archives = sbom["packages"]
assert sorted(f["fileName"] for f in sbom["files"]) == sorted("./" + f for f in glob.glob("roln*.h") + ["LICENSE"])
for f in sbom["files"]:
    true(f, f["fileName"])
one = sorted(c["checksumValue"] for f in sbom["files"] for c in f["checksums"] if c["algorithm"] == "SHA1")
assert hashlib.sha1("".join(one).encode()).hexdigest() == roln["packageVerificationCode"]["packageVerificationCodeValue"]
assert sorted(a["packageFileName"] for a in archives) == sorted(
    f[len("build/dist/"):] for f in glob.glob("build/dist/*.zip") + glob.glob("build/dist/*.gz"))
for a in archives:
    true(a, "build/dist/" + a["packageFileName"])
ids = [x["SPDXID"] for x in [sbom] + sbom["packages"] + sbom["files"]]
assert len(ids) == len(set(ids)) and all(re.fullmatch(r"SPDXRef-[A-Za-z0-9.-]+", i) for i in ids)
assert all(p["versionInfo"] == version and p["licenseDeclared"] == "MIT" for p in sbom["packages"])
assert {r["spdxElementId"] for r in sbom["relationships"]} | {r["relatedSpdxElement"] for r in sbom["relationships"]} == set(ids)
END
check python3 "$tmp/sbom.py" "$version"
# times: of the last commit of a repository of its own; not of one further up, of SOURCE_DATE_EPOCH before all
copy="$tmp/outer/roln"
mkdir -p "$copy/examples"
cp Makefile README.md LICENSE roln*.h "$copy"
cp -R .packaging "$copy"
cp examples/chain.h examples/chain_weights.h "$copy/examples"
commit() {
    git init -q "$1"
    GIT_COMMITTER_DATE='1234567890 +0000' git -C "$1" -c user.name=t -c user.email=t@t commit -q --allow-empty -m t
}
# dated TIME VARIABLE ..: a package made in the copy, with these in the environment, has files of that time
dated() {
    want=$1
    shift
    (cd "$copy" && env -u SOURCE_DATE_EPOCH "$@" make -s dist && [ "$(stat -c %Y build/dist/zephyr/roln/LICENSE)" = "$want" ])
}
check dated 315532800
check commit "$tmp/outer"
check dated 315532800
check dated 1000000000 SOURCE_DATE_EPOCH=1000000000
check commit "$copy"
check dated 1234567890

# unpack PACKAGE, directory of its headers: into $tmp/PACKAGE/roln, equal to build/dist/PACKAGE/roln, with what all hold
unpack() {
    mkdir "$tmp/$1"
    if [ "$1" = arduino ]; then
        check cmake -E chdir "$tmp/$1" cmake -E tar xf "$repo/build/dist/roln-$1-$version.zip"
    else
        check tar -C "$tmp/$1" -xf "build/dist/roln-$1-$version.tar.gz"
    fi
    check diff -r "build/dist/$1" "$tmp/$1"
    check cmp LICENSE "$tmp/$1/roln/LICENSE"
    check grep -q "find_package(roln $series REQUIRED)" "$tmp/$1/roln/README.md"
    check not grep -qE '\]\(([^h]|h[^t])' "$tmp/$1/roln/README.md" # links to what the package does not have
    for f in roln*.h; do check cmp "$f" "$tmp/$1/roln/$2/$f"; done
    check not grep -rq '@[A-Z]*@' "$tmp/$1"
}
for package in platformio:src arduino:src zephyr:include esp-idf:include; do unpack ${package%:*} ${package#*:}; done

# PlatformIO: JSON with the fields of the manifest, files that are there, the sketch as C++
cat > "$tmp/json.cmake" << 'END'
file(READ library.json text)
function(get name)
    string(JSON value GET "${text}" ${ARGN})
    set(${name} "${value}" PARENT_SCOPE)
endfunction()
foreach(key name version description license)
    get(value ${key})
    message("${key}=${value}")
endforeach()
string(JSON count LENGTH "${text}" headers)
string(JSON files LENGTH "${text}" examples 0 files)
get(base examples 0 base)
foreach(i RANGE 1 ${count})
    math(EXPR i "${i} - 1")
    get(header headers ${i})
    list(APPEND all src/${header})
endforeach()
foreach(i RANGE 1 ${files})
    math(EXPR i "${i} - 1")
    get(file examples 0 files ${i})
    list(APPEND all ${base}/${file})
endforeach()
list(APPEND all LICENSE README.md library.json)
list(SORT all)
foreach(file ${all})
    message("file ${file}")
endforeach()
END
cd "$tmp/platformio/roln" || exit 1
cmake -P "$tmp/json.cmake" > "$tmp/json" 2>&1
check same "$(grep '^file ' "$tmp/json")" "$(find . -type f | sed 's|^./|file |' | LC_ALL=C sort)"
for field in name=roln "version=$version" license=MIT 'description=[A-Z].*'; do check grep -qx "$field" "$tmp/json"; done
check grep -qx 'lib_deps = roln=symlink://../..' examples/tick/platformio.ini
check test -f examples/tick/../../library.json
check cmp examples/tick/src/main.cpp "$tmp/arduino/roln/examples/tick/tick.ino"

# Arduino: every required field once, with a value; the sketch under the name of its directory
cd "$tmp/arduino/roln" || exit 1
for key in name version author maintainer sentence paragraph category url architectures includes; do
    check same 1 "$(grep -c "^$key=[^ ]" library.properties)"
done
check not grep -qv '^[a-z]*=' library.properties
check grep -qx "version=$version" library.properties
check grep -qx 'category=Device Control' library.properties # one of nine that the library manager knows
for cc in g++ clang++; do
    set -- $cc -std=c++11 -Wall -Wextra -Werror -Isrc -I"$repo/tests/user/standin" -x c++ examples/tick/tick.ino
    check "$@" -o "$tmp/arduino/$cc"
    check "$@" -E -CC # as arduino-cli looks for prototypes: comments stay in macros
    check prints "$tmp/arduino/$cc"
done

# YAML as these files use it: keys in lower case, two blanks to go in, a value or a key below
yaml() { not grep -Evn '^(  )?[a-z_]+:( ("[^"]*"|[A-Za-z][^:#]*(:[^ ]+)?))?$' "$1"; }

# Zephyr: the example through the stand-in; without CONFIG_ROLN the headers are not found, an unknown option is refused
cd "$tmp/zephyr/roln" || exit 1
export ZEPHYR_BASE="$repo/tests/user/standin"
check yaml zephyr/module.yml
check grep -qx 'name: roln' zephyr/module.yml
check cmake -S samples/tick -B "$tmp/zephyr/build"
check cmake --build "$tmp/zephyr/build"
check prints "$tmp/zephyr/build/app"
check cmake -S samples/tick -B "$tmp/zephyr/off" -DCONF=CONFIG_ROLN=n
check not cmake --build "$tmp/zephyr/off"
check not cmake -S samples/tick -B "$tmp/zephyr/typo" -DCONF=CONFIG_ROLM=y

# ESP-IDF: the same
cd "$tmp/esp-idf/roln" || exit 1
export IDF_PATH="$repo/tests/user/standin"
check yaml idf_component.yml
check grep -qx "version: \"$version\"" idf_component.yml
for key in description license url; do check same 1 "$(grep -c "^$key: ." idf_component.yml)"; done
check cmake -S examples/tick -B "$tmp/esp-idf/build"
check cmake --build "$tmp/esp-idf/build"
check prints "$tmp/esp-idf/build/tick.elf"

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
