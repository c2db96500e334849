#!/bin/sh
# Runs every test and ends with "N passed, N failed".
#
# Unit tests (cmocka) and scripts print one "ok" or "not ok" line per test (TAP). A program that fails without a "not
# ok", or that prints neither, counts as one failure. The Makefile sets UNITS (programs), FARM (the program under test)
# and MPIEXEC.
set -u
cd "$(dirname "$0")/.." || exit 1
passed=0 failed=0 skipped=0
log=$(mktemp)
trap 'rm -f "$log"' EXIT

run_one() { # name command...
    name=$1; shift
    CMOCKA_MESSAGE_OUTPUT=TAP timeout 300 "$@" >"$log" 2>&1
    status=$?
    # cmocka prints "not ok N # SKIP" for a test that does not apply, such as that of permissions as root.
    left_out=$(grep -c '^not ok .*# SKIP' "$log") good=$(grep -c '^ok ' "$log")
    bad=$(($(grep -c '^not ok ' "$log") - left_out))
    if [ "$status" -ne 0 ] && [ "$bad" -eq 0 ]; then bad=1; fi
    if [ $((good + bad + left_out)) -eq 0 ]; then bad=1; fi
    passed=$((passed + good)) failed=$((failed + bad)) skipped=$((skipped + left_out))
    if [ "$bad" -eq 0 ]; then
        printf '%-28s %4d passed\n' "$name" "$good"
        sed -n 's/^not ok .*# SKIP/    skipped:/p' "$log"
    else
        printf '%-28s %4d passed, %d FAILED (exit status %d)\n' "$name" "$good" "$bad" "$status"
        grep -v '^ok ' "$log" | sed 's/^/    /'
    fi
}

# The unit tests detect leaks; the scripts do not, because of leaks inside MPI and its transport.
for unit in $UNITS; do
    run_one "$(basename "$unit")" "$unit"
done
export ASAN_OPTIONS="detect_leaks=0${ASAN_OPTIONS:+:$ASAN_OPTIONS}"
for script in test/test_*.sh; do
    run_one "$(basename "$script")" sh "$script"
done
[ "$skipped" -eq 0 ] || echo "$skipped skipped, as they do not apply here"
echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ] && [ "$passed" -gt 0 ]
