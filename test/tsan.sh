# tsan.sh, called by make tsan: whole runs of a farm that is compiled with the thread sanitizer. Status 1 if it finds a
# data race in any process. What processes share is not looked at, only what threads of one share.
set -u
FARM=$(realpath "${FARM:-build/tsan/farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
SCENE=$(realpath test/data/everything.ini)
T=$(mktemp -d)
farm= # runs in the background
trap '[ -z "$farm" ] || kill -KILL "$farm"; rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
cd "$T" || exit 1
# UCX replaces mmap() while a program runs, which the sanitizer does not survive.
export UCX_MEM_EVENTS=no TSAN_OPTIONS="log_path=$T/race exitcode=99"
failed=0

# judge STATUS TEXT: of the last run, which is to end with that status.
judge() {
    if [ "$got" -eq "$1" ] && ! ls race.* >/dev/null 2>&1; then
        echo "ok: $2"
    else
        failed=1
        echo "FAILED, status $got: $2"
        cat err race.* 2>/dev/null
    fi
    rm -f ./*
}

# whole PROCESSES SETTING...
whole() {
    n=$1; shift
    timeout 600 "$MPIEXEC" -n "$n" "$FARM" "$SCENE" image.width=64 image.height=48 output.image=a.png "$@" >out 2>err
    got=$?
    judge 0 "-n $n $*"
}

# A signal may be handled in any thread.
stopped() {
    "$FARM" "$SCENE" image.width=640 image.height=480 sampling.samples=64 output.image=a.png >out 2>err &
    farm=$!
    until [ -s a.journal ] || ! kill -0 $farm 2>/dev/null; do sleep 0.1; done
    sleep 1.5
    kill -INT $farm
    timeout 60 tail -f --pid=$farm /dev/null # a farm that hangs is killed
    kill -KILL $farm 2>/dev/null
    wait $farm
    got=$? farm=
    judge 75 "stopped by SIGINT"
}
whole 1
whole 3 sampling.samples=4 output.preview=0.1 output.trace=t.json output.heatmap=h.png output.ranks=r.png
whole 2 farm.master_renders=no farm.schedule=cyclic
whole 3 sampling.target_error=0.01 output.error=e.csv output.preview=0.1
whole 2 sampling.time_limit=5
stopped
exit $failed
