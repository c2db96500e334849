# valgrind.sh, called by make valgrind: whole runs under valgrind. Status 1 if it finds invalid reads or writes,
# uninitialised values or lost blocks in any process. (MPICH 4.0.2 needs no suppressions.)
set -u
FARM=$(realpath "${FARM:-./farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
SCENE=$(realpath test/data/everything.ini)
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
cd "$T" || exit 1
failed=0

# whole STATUS PROCESSES SETTING...
whole() {
    want=$1 n=$2; shift 2
    rm -f ./*
    timeout 600 "$MPIEXEC" -n "$n" valgrind --quiet --error-exitcode=99 --leak-check=full \
        --show-leak-kinds=definite --errors-for-leak-kinds=definite --log-file=log.%p \
        "$FARM" "$SCENE" image.width=32 image.height=24 output.image=a.pfm "$@" >out 2>err
    got=$?
    grep -hv 'WARNING: valgrind ignores shmget' log.* >found # huge pages, of UCX
    if [ $got -eq "$want" ] && [ ! -s found ]; then
        echo "ok: -n $n $*"
    else
        failed=1
        echo "FAILED, status $got: -n $n $*"
        cat err found
    fi
}
whole 0 1
whole 0 2 sampling.samples=4 output.preview=1 output.trace=t.json output.heatmap=h.png output.ranks=r.png
whole 0 2 farm.master_renders=no farm.schedule=cyclic
whole 0 3 farm.schedule=strips render.cutoff=0 sampling.samples=2
whole 0 2 sampling.target_error=0.02 sampling.max_samples=64 output.error=e.csv
whole 0 2 sampling.time_limit=8
whole 2 2 camera.fov=0
exit $failed
