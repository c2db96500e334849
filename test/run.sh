#!/bin/sh
# run.sh: runs every test and ends with "N passed, N failed". run.sh LOGS TEST: runs one of them, with its output
# and its counts in the folder LOGS.
#
# Unit tests (cmocka) and scripts print one "ok" or "not ok" line per test (TAP). A program that fails without a "not
# ok", or that prints neither, counts as one failure. The Makefile sets UNITS (programs), FARM (the program under test)
# and MPIEXEC.
set -u

# Ctrl-C ends the test that is running, with all that it has started: a session of its own, because what timeout(1)
# starts gets no Ctrl-C. The shell waits for it in the background, as it would else heed the signal after the test only.
session=
trap '[ -z "$session" ] || pkill -s "$session"; exit 130' INT TERM

run_one() { # LOGS TEST: a unit test or a script
    logs=$1 path=$2
    name=$(basename "$path")
    # Unit tests detect leaks; scripts do not, because of leaks inside MPI and its transport.
    set -- "$path"
    case $path in *.sh) set -- env ASAN_OPTIONS="detect_leaks=0${ASAN_OPTIONS:+:$ASAN_OPTIONS}" sh "$path" ;; esac
    log=$logs/$(echo "$path" | tr / _) # units of several levels of the kernel have the same name
    CMOCKA_MESSAGE_OUTPUT=TAP setsid timeout 300 "$@" >"$log" 2>&1 &
    session=$!
    wait "$session" 2>/dev/null # without what some shells say of a crash
    status=$? session=
    # cmocka prints "not ok N # SKIP" for a test that does not apply, such as that of permissions as root.
    left_out=$(grep -c '^not ok .*# SKIP' "$log") good=$(grep -c '^ok ' "$log")
    bad=$(($(grep -c '^not ok ' "$log") - left_out))
    if [ "$status" -ne 0 ] && [ "$bad" -eq 0 ]; then bad=1; fi
    if [ $((good + bad + left_out)) -eq 0 ]; then bad=1; fi
    echo "$good $bad $left_out" >"$log.counts"
    if [ "$bad" -eq 0 ]; then
        printf '%-28s %4d passed\n' "$name" "$good"
        sed -n 's/^not ok .*# SKIP/    skipped:/p' "$log"
    else
        printf '%-28s %4d passed, %d FAILED (exit status %d)\n' "$name" "$good" "$bad" "$status"
        grep -v '^ok ' "$log" | sed 's/^/    /'
    fi >"$log.lines"
    cat "$log.lines" # at once: others run at the same time
}

if [ $# -gt 0 ]; then run_one "$@"; exit; fi
cd "$(dirname "$0")/.." || exit 1
logs=$(mktemp -d)
trap 'rm -rf "$logs"' EXIT

# A unit test is one process, most of the time of one thread: one on each core, beside the scripts that start one such
# process at a time, or three for a moment (numerics). The other scripts start farms that use all cores, and some
# measure time: one after the other.
single=" error_bench extreme house kernel numerics omit run stability stability_levels truncation "
beside= alone=
for script in test/test_*.sh; do
    name=${script#test/test_}
    case $single in *" ${name%.sh} "*) beside="$beside $script" ;; *) alone="$alone $script" ;; esac
done
printf '%s\n' $beside $UNITS | xargs -r -P "$(nproc)" -n 1 sh test/run.sh "$logs"
for script in $alone; do
    run_one "$logs" "$script"
done
tests=$(($(printf '%s\n' $UNITS test/test_*.sh | wc -l)))
cat "$logs"/*.counts | awk -v tests="$tests" '
    { passed += $1; failed += $2; skipped += $3 }
    END {
        failed += tests - NR # one that left no counts
        if (skipped) print skipped " skipped, as they do not apply here"
        print passed + 0 " passed, " failed + 0 " failed"
        exit failed > 0 || !passed
    }'
