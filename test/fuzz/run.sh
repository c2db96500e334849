#!/bin/sh
# run.sh FOLDER TARGET...: runs fuzz targets one after the other, which are the programs FOLDER/fuzz_TARGET. New inputs
# of interest are kept in FOLDER/corpus, inputs that break a promise in FOLDER/found. FUZZ_SECONDS (30) or FUZZ_RUNS
# limit each target; FUZZ_OPTIONS are passed to libFuzzer.
set -u
# Short allocation stacks and a small quarantine of freed blocks allow a third more inputs per second.
export ASAN_OPTIONS="malloc_context_size=3:quarantine_size_mb=16${ASAN_OPTIONS:+:$ASAN_OPTIONS}"
folder=$1; shift
here=$(dirname "$0")
FUZZ_FOLDER=$(mktemp -d -p "$([ -w /dev/shm ] && echo /dev/shm || echo "${TMPDIR:-/tmp}")")
export FUZZ_FOLDER
trap 'rm -rf "$FUZZ_FOLDER"' EXIT
trap 'exit 1' INT TERM HUP
cp test/data/*.* "$FUZZ_FOLDER"
if [ -n "${FUZZ_RUNS:-}" ]; then bound=-runs=$FUZZ_RUNS; else bound=-max_total_time=${FUZZ_SECONDS:-30}; fi
# Inputs are small: what breaks a parser is short, and twice the size is half the speed.
largest=1400
failed=0
mkdir -p "$folder/found"
printf '%-10s %12s %10s %8s  %s\n' target executions per_second corpus result
for target; do
    corpus=$folder/corpus/$target log=$folder/$target.log
    mkdir -p "$corpus"
    seeds=$(find config test/data -name "*.$target" -size -3k | paste -sd ,)
    # shellcheck disable=SC2086 # options are words
    "$folder/fuzz_$target" "$bound" -max_len=$largest -timeout=10 -rss_limit_mb=1024 \
        -dict="$here/dict/$target" -artifact_prefix="$folder/found/$target-" -print_final_stats=1 \
        ${seeds:+"-seed_inputs=$seeds"} ${FUZZ_OPTIONS:-} "$corpus" "$here/corpus/$target" >"$log" 2>&1
    status=$?
    done=$(sed -n 's/^stat::number_of_executed_units: *//p' "$log")
    speed=$(sed -n 's/^stat::average_exec_per_sec: *//p' "$log")
    if [ "$status" -eq 0 ]; then result=clean; else result="BROKEN, see $log"; failed=1; fi
    printf '%-10s %12s %10s %8s  %s\n' "$target" "${done:-?}" "${speed:-?}" \
        "$(find "$corpus" -type f | wc -l)" "$result"
done
exit $failed
