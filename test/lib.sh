# Functions for the test scripts, which source this file. They print one "ok" or "not ok" line per check (TAP). FARM is
# the program under test, MPIEXEC starts it on several processes, T is a temporary folder.
set -u
FARM=$(realpath "${FARM:-./farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
DATA=$(realpath test/data)
CONFIG=$(realpath config)
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
# Standard input never ends: mpiexec passes the end of its input on to the ranks, and if all of them have left by then,
# it is killed by SIGPIPE (status 141 instead of theirs).
mkfifo "$T/input" && exec <>"$T/input"
count=0
failed=0

ok() { count=$((count + 1)); echo "ok $count - $*"; }
not_ok() { count=$((count + 1)); failed=1; echo "not ok $count - $*"; }

# check NAME COMMAND...: a check that passes if the command succeeds; otherwise its output is printed.
check() {
    name=$1; shift
    if "$@" >"$T/check.log" 2>&1; then ok "$name"; else not_ok "$name"; sed 's/^/# /' "$T/check.log"; fi
}

# run STATUS COMMAND...: whether the command ends with STATUS. Sets out and err to its output.
run() {
    want=$1; shift
    "$@" >"$T/out" 2>"$T/err"
    got=$?
    out=$(cat "$T/out") err=$(cat "$T/err")
    [ "$got" -eq "$want" ] && return 0
    echo "# exit status $got instead of $want: $*"
    sed 's/^/# /' "$T/out" "$T/err"
    return 1
}

# farm_n N ARGUMENT...: runs the farm on N processes for at most a minute. N = 0: without mpiexec.
farm_n() {
    processes=$1; shift
    if [ "$processes" -eq 0 ]; then timeout 60 "$FARM" "$@"
    else timeout 60 "$MPIEXEC" -n "$processes" "$FARM" "$@"; fi
}

lines() { printf '%s\n' "$1" | grep -c .; }

finish() { [ "$failed" -eq 0 ]; exit; }
