#!/bin/sh
# run.sh - every test, one line each; called by `make test`. Last line: N passed, N failed.
# A step is a command whose last line is `N passed, N failed`; its output is in build/log/. Nothing passed, nothing failed
# is a failure.
cd "$(dirname "$0")/.." || exit 1
mkdir -p build/log
passed=0
failed=0

step() {
    name=$1
    shift
    start=$(date +%s)
    "$@" > "build/log/$name" 2>&1
    code=$?
    last=$(grep -E '^[0-9]+ passed, [0-9]+ failed' "build/log/$name" | tail -n 1)
    p=$(echo "$last" | sed -n 's/^\([0-9]*\) passed.*/\1/p')
    f=$(echo "$last" | sed -n 's/.* \([0-9]*\) failed.*/\1/p')
    # crashed, did not even start, or tested nothing
    if [ -z "$p" ] || { [ "$f" -eq 0 ] && { [ "$code" -ne 0 ] || [ "$p" -eq 0 ]; }; }; then
        p=${p:-0}
        f=1
    fi
    passed=$((passed + p))
    failed=$((failed + f))
    printf '%-12s %8d passed, %d failed, %d s\n' "$name" "$p" "$f" $(($(date +%s) - start))
    if [ "$f" -ne 0 ]; then tail -n 40 "build/log/$name" | sed 's/^/    /'; fi
}

step warnings sh tests/warnings.sh
step config sh tests/config.sh
step unit build/test
step hash sh tests/hash.sh host
step targets sh tests/hash.sh targets
step symbols sh tests/symbols.sh
step readme sh tests/readme.sh
step examples sh tests/examples.sh
# elementary: no memory, and millions of calls
step sanitize-au build/test_asan dense eig spd ae lnn riem roln control
step sanitize-m build/test_msan dense eig spd ae lnn riem roln control
step coverage sh tests/coverage.sh
step mujoco build/test_mujoco
step latent build/test_latent
step opinf build/test_opinf
step experiments build/test_experiments
step packaging sh tests/packaging.sh
step train sh tests/train.sh
step firmware sh tests/firmware.sh
step sizes sh tests/sizes/sizes.sh test
step pil build/pil host m4 rv32

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
