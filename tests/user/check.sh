# SPDX-License-Identifier: MIT
# check.sh - what tests of a user's programs share: an empty $dir, and counts of checks. Sourced at the root of the repository.
rm -rf $dir
mkdir -p $dir
passed=0
failed=0
# check WHAT COMMAND ..: it succeeds
check() {
    what=$1
    shift
    if "$@" > $dir/check.log 2>&1; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "$what"
        tail -n 20 $dir/check.log
    fi
}
