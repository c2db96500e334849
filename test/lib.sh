# For the test scripts: sourced, not run. One "ok" or "not ok" line per check (TAP).
# FARM is the program under test, MPIEXEC starts it on several processes, T is a folder of our own.
set -u
FARM=$(realpath "${FARM:-./farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
DATA=$(realpath test/data)
CONFIG=$(realpath config)
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
# An input that never ends: mpiexec hands on the end of its own, and where all ranks have left by then, it
# dies of that (SIGPIPE, status 141 in place of theirs).
mkfifo "$T/input" && exec <>"$T/input"
count=0
failed=0

ok() { count=$((count + 1)); echo "ok $count - $*"; }
not_ok() { count=$((count + 1)); failed=1; echo "not ok $count - $*"; }

# check NAME COMMAND...: passes when the command succeeds; shows its output otherwise.
check() {
    name=$1; shift
    if "$@" >"$T/check.log" 2>&1; then ok "$name"; else not_ok "$name"; sed 's/^/# /' "$T/check.log"; fi
}

# run STATUS COMMAND...: whether it ends with STATUS; out and err hold what it said.
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

# farm_n N ARGUMENT...: the farm on N processes, a minute at most; 0 means without mpiexec.
farm_n() {
    processes=$1; shift
    if [ "$processes" -eq 0 ]; then timeout 60 "$FARM" "$@"
    else timeout 60 "$MPIEXEC" -n "$processes" "$FARM" "$@"; fi
}

lines() { printf '%s\n' "$1" | grep -c .; }

finish() { [ "$failed" -eq 0 ]; exit; }
