#!/bin/sh
# SPDX-License-Identifier: MIT
# sizes.sh - what a model needs on a microcontroller: builds firmware.c for each model, core and level, checks the image, runs it in
# QEMU, writes build/sizes/table.md and compares it with the table in README.md or docs/: between `<!-- sizes -->` and
# `<!-- end of sizes -->`. Last line: N passed, N failed.
#
#   sizes.sh            everything: make sizes, a quarter of an hour of one core
#   sizes.sh test       the lines of `some` below; what they leave out counts as equal, and fewer states must lie within the range
#   sizes.sh -w         everything, into that text
#
# JOBS=1 for one core. Code and constants, weights and RAM are those of firmware.o in the linked image (its map): without start-up,
# mem* and measure.c, which draws the states. Stack: stack.awk; what measure.c finds painted over is within. At -O2 longest.c, too:
# the worst case in instructions, over 100 states (cloth: 3); and images that filter, observe or doubt, but not where `some` asks
# for few states.
cd "$(dirname "$0")/../.." || exit 1
here=tests/measure
out=build/sizes
text=$(grep -lx '<!-- sizes -->' README.md docs/*.md 2> /dev/null | head -n 1)
[ -n "$text" ] || { echo 'no text with <!-- sizes -->'; echo '0 passed, 1 failed'; exit 1; }
own='board_[a-z]+|start|start_memory|fault|fault_report|trap|trap_report|systick|main|tick|ahead|train|filter|observe|doubt|weights'
allowed='mem(cpy|set|cmp|move)'
warn='-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wundef -Wcast-qual -Wvla -Wstrict-prototypes
      -Wmissing-prototypes -Werror'

all() { # what takes longest first
    echo cloth m4 -O2 10000
    for model in cloth pend16 chain; do
        for core in rv32 m4 m7 m33 m55; do
            for level in -Os -O2 -O3; do
                case "$model $core$level" in
                'cloth m4-O2') ;;
                cloth*) echo $model $core $level 1000 ;;
                *) echo $model $core $level 10000 ;;
                esac
            done
        done
    done
}

some() {
    cat << 'end'
pend16 m4 -O2 10000
chain m4 -O2 10000
cloth m4 -O2 100
cloth rv32 -Os 30
pend16 m4 -Os 300
pend16 m4 -O3 300
pend16 m7 -O2 300
pend16 m33 -O2 300
pend16 m55 -O2 300
pend16 rv32 -O2 300
end
}

# check text command ..: of one image
check() {
    text=$1
    shift
    if "$@" > "$image.log" 2>&1; then echo ok
    else echo "failed $model $core $level$part: $text"; head -n 5 "$image.log" | sed 's/^/failed     /'; fi
}

# Bytes of firmware.o in the linked image: code and constants, weights, RAM.
parts() {
    awk 'function hex(s,   x, i) { for (i = 3; i <= length(s); i++) x = 16 * x + index("0123456789abcdef", substr(s, i, 1)) - 1
                                   return x }
         /^Linker script and memory map/ { on = 1 }
         !on || !/^ (\.|COMMON)/ { next }
         { section = $1; if (NF == 1) { getline; size = $2; file = $3 } else { size = $3; file = $4 } }
         file !~ /-firmware\.o$/ || section == ".rodata.measure" { next }
         section == ".rodata.weights" { weights += hex(size); next }
         section ~ /^\.(text|s?rodata|s?data)/ { code += hex(size) }
         section ~ /^(\.s?data|\.s?bss|COMMON)/ { ram += hex(size) }
         END { print code + 0, weights + 0, ram + 0 }' "$image.map"
}

# The longest way: instructions seen and at worst, of a tick, a step, a tick of the filter, of the observer, a doubt; then of a tick
# whose guard checks novelty, and of the filter by leapfrog.
longest() {
    worst
    all_ways=$ways
    worst -DDOUBT -DROLN_FILTER=leapfrog
    ways=$all_ways$(echo "$ways" | cut -d ' ' -f 1,2,5,6)
}
worst() {
    part=$(echo "-DWORST$*" | tr -d ' ')
    image=$out/$model$core$level$part.elf
    case $model in cloth) few=3 ;; *) few=100 ;; esac
    options="$level -DWORST $* -DMODEL=$model -DSTATES=$few -I$here -I$out"
    check 'warnings' sh examples/firmware/cc.sh "$core" $options $warn -fsyntax-only $here/firmware.c $here/longest.c
    check 'does not build' sh examples/firmware/cc.sh "$core" $options $here/firmware.c $here/longest.c -o "$image"
    sh examples/firmware/run.sh "$core" "$image" > "$image.txt"
    check 'fails' [ $? -eq 0 ]
    ways=$(awk '{ printf "%s %s ", $2, $3 }' "$image.txt")
}

# build more option ..: the image that controls and calls `more`, too, nothing if that is ''. found: its code, weights, RAM;
# deepest: stack of all it calls, alone: of `more`.
build() {
    more=$1
    shift
    part=$(echo "$*" | tr -d ' ')
    image=$out/$model$core$level$part.elf
    options="$level $* -DMODEL=$model -DSTATES=$states -I$here -I$out"
    rm -f "$image"*
    check 'warnings' sh examples/firmware/cc.sh "$core" $options $warn -fsyntax-only $here/firmware.c $here/measure.c
    check 'does not build' sh examples/firmware/cc.sh "$core" $options -save-temps=obj -fcallgraph-info=su \
        -Wl,-Map="$image.map" $here/firmware.c $here/measure.c -o "$image"
    [ -f "$image" ] || return
    # all functions of the image that are not of examples/firmware, which on rv32 shifts 64 bits, and what firmware.o calls
    found=$({ arm-none-eabi-nm -g --defined-only "$image" | awk '$2 ~ /^[TtWw]$/ { print $3 }' | grep -vxE "$own|__lshrdi3"
              arm-none-eabi-nm -u "$image-firmware.o" | awk '{ print $2 }'; } | grep -vxE "$allowed" | tr '\n' ' ')
    check "holds $found" [ -z "$found" ]
    $objdump -d --no-show-raw-insn "$image" > "$image.dis"
    sh examples/firmware/run.sh "$core" "$image" > "$image.txt"
    check 'fails' [ $? -eq 0 ]
    awk -v entries="tick ahead $more" -f $here/stack.awk "$image-firmware.ci" "$image-firmware.s" "$image.dis" > "$image.stack"
    check 'no bound of the stack' sh -c '! grep "^stack:" "$0"' "$image.stack"
    check 'measured stack above the proven one, or below half of it' awk '
        NR == FNR { bound[$1] = $2; next }
        $1 in bound { print $1, $2, bound[$1]; n++; if ($2 > bound[$1] || 2 * $2 < bound[$1]) bad = 1 }
        END { for (e in bound) n--; exit bad || n != 0 }' "$image.stack" "$image.txt"
    deepest=$(sort -n -k 2 "$image.stack" | awk 'END { print $2 }')
    alone=$(awk -v more="$more" '$1 == more { print $2 }' "$image.stack")
    found=$(parts)
    rm -f "$image"-*
}

# What an image that estimates velocities or doubts needs more than the one that controls: code, flash of data, RAM; and the stack
# of that call alone.
beside() {
    build "$@"
    echo "$controls $found $alone" | awk '{ print $4 - $1, $5 - $2, $6 - $3, $7 }' > "$image.beside"
    besides="$besides $(cat "$image.beside")"
}

# One row: model core level states, code weights RAM, stack of the image that controls; code RAM stack of the one that learns, too;
# least and most instructions of a tick; at -O2 the longest way, and what filter, filter by leapfrog, observer and doubt take.
one() {
    model=$1 core=$2 level=$3 states=$4 learns='- - -' ways= besides=
    objdump=arm-none-eabi-objdump
    [ "$core" = rv32 ] && objdump=riscv64-unknown-elf-objdump
    build ''
    controls="$found" stack=$deepest counts=$(awk '/^instructions/ { print $2, $3 }' "$image.txt")
    if [ "$model" != cloth ]; then # weights, gradient, moments: more RAM than the boards have
        build train -DTRAIN
        learns="$(echo "$found" | awk '{ print $1, $3 }') $deepest"
    fi
    if [ "$level" = -O2 ]; then
        longest
        [ "$states" -ge 1000 ] && beside filter -DFILTER && beside filter -DFILTER -DROLN_FILTER=leapfrog &&
            beside observe -DOBSERVE && beside doubt -DDOUBT && check 'evidence takes more stack' [ "$deepest" -le "$stack" ]
    fi
    echo "row $model $core $level $states $controls $stack $learns $counts $ways$besides"
}

# The table from the rows. What was not made is ?; a range over fewer states than `all` says begins with ~.
table() {
    arm=$(arm-none-eabi-gcc -dumpfullversion) riscv=$(riscv64-unknown-elf-gcc -dumpfullversion)
    all | awk -v versions="gcc $arm (arm-none-eabi), $riscv (riscv64-unknown-elf)" '
        function cell(key) { return key in value ? value[key] : "?" }
        function levels(key) { return cell(key "-Os") " / " cell(key "-O2") " / " cell(key "-O3") }
        function once(key, x) { if (key in value && value[key] != x) x = "differs"; value[key] = x }
        function thousand(x) { return sprintf("%.1f", x / 1000) }
        $1 != "row" { states[$1 " " $2 " " $3] = $4; next }
        { key = $2 " " $3 " " $4
          value["code " key] = thousand($6); value["stack " key] = $9
          once("weights " $2, $7); once("ram " $2, $8); once("learnram " $2, $11)
          value["learn " key] = $10 == "-" ? "-" : thousand($10); value["learnstack " key] = $12
          if (NF > 15) value["ways " key] = thousand($16) " | " thousand($17) " / " thousand($18) " | " \
              sprintf("%.0f / %.0f", $19 / 1000, $20 / 1000) " | " thousand($27) " / " thousand($28) " | " \
              thousand($21) " / " thousand($22) " | " thousand($24) " | " thousand($26)
          for (i = 29; i < NF; i += 4) {
              what = (i - 29) / 4
              value["beside " key] = value["beside " key] " | " thousand($i) " / " $(i + 3)
              once("data" what " " $2, $(i + 1)); once("ram" what " " $2, $(i + 2))
          }
          value["tick " key] = ($5 < states[key] ? "~" : "") thousand($13) "-" thousand($14) }
        END {
          print "| model | weights in flash | RAM | RAM to learn, too | more RAM: filter | ... by leapfrog | observer | doubt | " \
              "more flash: gains of observer | evidence |\n|---|---|---|---|---|---|---|---|---|---|"
          k = split("chain, 8 joints, n = 2, networks 16 x 2|pend16, 16 joints, n = 4, 32 x 2|" \
                    "cloth, 600 sliders, n = 10, 64 x 2, damping", text, "|")
          for (i = 1; i <= k; i++) {
              model = text[i]
              sub(/,.*/, "", model)
              print "| " text[i] " | " cell("weights " model) " | " cell("ram " model) " | " cell("learnram " model) " | " \
                  cell("ram0 " model) " | " cell("ram1 " model) " | " cell("ram2 " model) " | " cell("ram3 " model) " | " \
                  cell("data2 " model) " | " cell("data3 " model) " |"
          }
          c = split("m4 M4F|m7 M7|m33 M33|m55 M55|rv32 RV32", cores, "|")
          for (i = 1; i <= k; i++)
              for (j = 1; j <= c; j++) {
                  model = text[i]
                  sub(/,.*/, "", model)
                  split(cores[j], core, " ")
                  name = "| " model ", " core[2] " | "
                  at = " " model " " core[1] " "
                  seen = seen name levels("code" at) " | " levels("stack" at) " | " levels("tick" at) " | " levels("learn" at) \
                      " | " levels("learnstack" at) " |\n"
                  none = "? | ? / ? | ? / ? | ? / ? | ? / ? | ? | ?"
                  worst = worst name (("ways" at "-O2") in value ? value["ways" at "-O2"] : none) " |\n"
                  none = " | ? / ? | ? / ? | ? / ? | ? / ?"
                  beside = beside substr(name, 1, length(name) - 3) \
                      (("beside" at "-O2") in value ? value["beside" at "-O2"] : none) " |\n"
              }
          print "\n| -Os / -O2 / -O3 | code, kB | stack | instructions of a tick, thousands | code to learn, too, kB | stack |"
          printf "|---|---|---|---|---|---|\n%s", seen
          print "\n| -O2, thousands of instructions | tick, at worst | step, seen / at worst | " \
              "tick of the filter, seen / at worst | ... by leapfrog | tick of the observer | doubt, at worst | " \
              "tick with evidence, at worst |"
          printf "|---|---|---|---|---|---|---|---|\n%s", worst
          print "\n| -O2, more code, kB / stack of the call | filter | ... by leapfrog | observer | evidence and doubt |"
          printf "|---|---|---|---|---|\n%s", beside
          print "\n" versions
        }' - $out/rows > $out/table.md
}

# Each line that was asked for has one row, with a number in every place: else ? would stand in the table, which counts as equal.
whole() {
    awk 'FILENAME ~ /rows$/ { key = $2 " " $3 " " $4 " " $5; rows[key]++
                              bad[key] = NF != ($4 != "-O2" ? 14 : $5 < 1000 ? 28 : 44)
                              for (i = 6; i <= NF; i++)
                                  if ($i !~ /^[0-9]+$/ && !($2 == "cloth" && i >= 10 && i <= 12 && $i == "-")) bad[key] = 1
                              next }
         { key = $1 " " $2 " " $3 " " $4
           if (rows[key] != 1 || bad[key]) print "failed " key ": no row, or figures are missing in it"
           else print "ok" }' $out/rows $out/asked
}

# Token by token; other versions of gcc: numbers within a tenth. ~a-b lies in the range of the text, within 2 % of its ends.
compare() {
    awk '/^<!-- sizes -->$/ { on = 1; next } /^<!-- end of sizes -->$/ { on = 0 } on' "$text" > $out/text.md
    awk -v text="$text" 'function number(x) { return x ~ /^[0-9.]+$/ }
         function same(a, b) { return a == b || other && number(a) && number(b) && a <= 1.1 * b && b <= 1.1 * a }
         function between(a, low, high, b) { a += 0; return a >= low * b && a <= high * b }
         function range(a, b,   x, y) {
             if (split(a, x, "-") != 2 || split(b, y, "-") != 2) return a == b
             if (sub(/^~/, "", x[1]))
                 return between(x[1], other ? 0.9 : 1, other ? 1.1 : 1.02, y[1]) &&
                        between(x[2], other ? 0.9 : 0.98, other ? 1.1 : 1, y[2])
             return same(x[1], y[1]) && same(x[2], y[2])
         }
         FILENAME ~ /text/ { want[FNR] = $0; lines = FNR; next }
         /^gcc / && $0 != want[FNR] { print "note " text ": " want[FNR] "; here: " $0 ", so numbers within 10 %"; }
         { got[FNR] = $0; rows = FNR }
         END {
             other = got[rows] != want[lines]
             if (rows != lines) { print "failed " text " has " lines " lines of sizes, not " rows; exit }
             for (r = 1; r < rows; r++) {
                 k = split(got[r], a, " "); bad = split(want[r], b, " ") != k
                 for (i = 1; i <= k; i++) if (a[i] != "?" && !same(a[i], b[i]) && !range(a[i], b[i])) bad = 1
                 print bad ? "failed " text ": " want[r] "\nfailed  here: " got[r] : "ok"
             }
         }' $out/text.md $out/table.md
}

if [ "$1" = one ]; then
    shift
    one "$@" > $out/$1$2$3.row
    exit
fi
mkdir -p $out
rm -f $out/*.row
for m in pend16:tests/mujoco/models/pend16 cloth:tests/experiments/weights/cloth-free-layers-1; do
    ${CC:-cc} -std=c99 -O1 -ffp-contract=off -I. -Iexamples -I$here -DMODEL=${m%%:*} $here/weights.c -o $out/weights -lm &&
        $out/weights < ${m#*:}.roln > $out/${m%%:*}_weights.h || { echo '0 passed, 1 failed'; exit 1; }
done
case $1 in test) some ;; *) all ;; esac > $out/asked
xargs -P "${JOBS:-$(nproc)}" -L 1 sh $here/sizes.sh one < $out/asked
cat $out/*.row > $out/all
grep '^row' $out/all > $out/rows
whole >> $out/all
table
if [ "$1" = -w ] && ! grep -q '^failed' $out/all; then
    awk -v table=$out/table.md '/^<!-- end of sizes -->$/ { on = 0 } !on
         /^<!-- sizes -->$/ { on = 1; while ((getline line < table) > 0) print line }' "$text" > $out/new.md &&
        cp $out/new.md "$text"
fi
compare >> $out/all
[ "$1" = test ] || cat $out/table.md
sed -n 's/^failed //p; s/^note //p' $out/all
failed=$(grep -c '^failed [^ ]' $out/all)
echo "$(grep -c '^ok$' $out/all) passed, $failed failed"
[ "$failed" -eq 0 ]
