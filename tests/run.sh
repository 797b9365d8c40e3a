#!/bin/sh
# SPDX-License-Identifier: MIT
# run.sh - runs steps of the tests, one line each. Last line: N passed, N failed.
#
#   run.sh test         the steps that every change must pass: `make test`
#   run.sh release      all steps: `make release`
#   run.sh NAME ..      these steps. Logs of the others stay. Their programs are those of `make release`
#
# JOBS steps run at a time, by default as many as there are cores.
# A step is a command whose last line is `N passed, N failed`; its output is in build/log/NAME. One that ends otherwise, or passed
# nothing, has failed. Each step uses one core, so that two of them are as fast on two cores as one that could use both.
cd "$(dirname "$0")/.." || exit 1
log=build/log
jobs=${JOBS:-$(nproc)}
export JOBS=1
unset MAKEFLAGS MFLAGS MAKELEVEL

# Steps of `run.sh test`, in this order: parts of the steps of `run.sh release`, each with a name of its own, and whole ones.
quick='train address programs sample recordings regression logger mujoco
       readme record import warn sources style bits lint list macros deps'
parts() {
    cat << 'end'
sample       build/test_double sample
address      build/test_address sample
programs     sh tests/user/examples.sh few
warn         sh tests/compilers/warnings.sh test
bits         sh tests/compilers/hash.sh test few
end
}

# All steps of `run.sh release`. What takes longest comes first.
steps() {
    cat << 'end'
proof        sh tests/safety/proof/proof.sh
unit         build/test
coverage     python3 tests/safety/coverage.py
train        sh tests/user/train.sh
endings      sh tests/user/endings.sh
targets      sh tests/compilers/hash.sh test targets
examples     sh tests/user/examples.sh
analyzers    sh tests/safety/analyzers.sh
sanitize-au  build/test_asan sample
misra        python3 tests/safety/misra.py
mujoco       build/test_mujoco
hash         sh tests/compilers/hash.sh test host
pil          build/pil test host m4 rv32
config       sh tests/compilers/config.sh
sanitize-m   build/test_msan sample
firmware     sh tests/firmware/firmware.sh
mutants      python3 tests/safety/mutants.py quick
sizes        sh tests/measure/sizes.sh test
fuzz         sh tests/safety/fuzz.sh test
warnings     sh tests/compilers/warnings.sh
sources      sh tests/compilers/sources.sh
readme       sh tests/user/readme.sh
machines     build/machines m4 rv32
record       sh tests/user/record.sh
experiments  build/test_experiments
packaging    sh tests/user/packaging.sh
symbols      sh tests/compilers/symbols.sh
macros       sh tests/compilers/macros.sh
plansize     sh tests/measure/plan.sh test
numerics     sh tests/safety/numerics.sh test
recordings   python3 tests/user/recordings.py
logger       python3 tests/user/logger.py
import       sh tests/user/import.sh
regression   build/regression
start        sh tests/user/start.sh
smoother     sh tests/user/smoother.sh
next         sh tests/user/next.sh
mpi          sh tests/user/mpi.sh
steady       sh tests/safety/steady.sh
style        sh tests/style/style.sh
upsets       sh tests/firmware/upsets.sh test
plans        build/plans test
threads      sh tests/safety/threads.sh
fast         sh tests/safety/fast.sh
hour         build/hour
swing        build/swing test
alarms       build/alarms test
robust       build/robust test
list         sh tests/compilers/list.sh
rope         build/rope check
lint         sh tests/user/lint.sh
deps         sh tests/user/deps.sh
soundness    sh tests/safety/soundness.sh
end
}

# one step: its output; then in NAME.end the exit code, seconds, and seconds of processors that it and its children took
if [ "$1" = one ]; then
    name=$2
    shift 2
    start=$(date +%s)
    "$@" > "$log/$name" 2>&1
    code=$?
    seconds=$(($(date +%s) - start))
    times > "$log/$name.part" # not in a pipe, for there it would be another shell's
    awk -v code=$code -v seconds=$seconds 'NR == 2 { split($0, t, /[ms ]+/); cpu = 60 * (t[1] + t[3]) + t[2] + t[4] }
        END { printf "%d %d %.0f\n", code, seconds, cpu }' "$log/$name.part" > "$log/$name.time"
    mv "$log/$name.time" "$log/$name.end" # there it is whole
    exit 0
fi

mkdir -p $log
case $1 in
release) steps ;;
test) for name in $quick; do { parts; steps; } | grep "^$name "; done ;;
*) for name in "$@"; do { parts; steps; } | grep "^$name " || echo "$name no-such-step"; done ;;
esac > $log/steps
twice=$({ parts; steps; } | awk '{ print $1 }' | sort | uniq -d)
if [ "$twice" ]; then echo "run.sh: two steps named $twice" && exit 1; fi
for name in $(awk '{ print $1 }' $log/steps); do rm -f "$log/$name" "$log/$name".*; done
{ # soundness reads what the others said
    grep -v '^soundness ' $log/steps | xargs -r -P "$jobs" -L 1 sh tests/run.sh one
    grep '^soundness ' $log/steps | xargs -r -L 1 sh tests/run.sh one
} &
runner=$!
passed=0
failed=0
for name in $(awk '{ print $1 }' $log/steps); do # in this order, whichever ends first
    while [ ! -f "$log/$name.end" ] && kill -0 $runner 2> /dev/null; do sleep 1; done
    code=1 seconds='?' cpu='?' p= f=
    [ ! -f "$log/$name.end" ] || read -r code seconds cpu < "$log/$name.end"
    eval "$(sed -n 's/^\([0-9]*\) passed, \([0-9]*\) failed$/p=\1 f=\2/p' "$log/$name" | tail -n 1)"
    # crashed, did not even start, or tested nothing
    if [ -z "$p" ] || { [ "$f" -eq 0 ] && { [ "$code" -ne 0 ] || [ "$p" -eq 0 ]; }; }; then p=${p:-0} f=1; fi
    passed=$((passed + p))
    failed=$((failed + f))
    printf '%-12s %8d passed, %d failed, %s s, %s s of a core\n' "$name" "$p" "$f" "$seconds" "$cpu"
    if [ "$f" -ne 0 ]; then tail -n 40 "$log/$name" | sed 's/^/    /'; fi
done

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
