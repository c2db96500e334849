# A renderer that stops answering does not keep the others from finishing the picture.
. test/lib.sh
cd "$T" || exit 1
SCENE=$CONFIG/hello.ini

# Processes of the farm that mpiexec, of this id, has started, by rank.
ranks_of() {
    for proxy in $(pgrep -P "$1"); do pgrep -P "$proxy" -x farm; done
}

picture() { run 0 farm_n 0 "$SCENE" sampling.samples=400 image.width=160 image.height=120 \
    output.image=reference.pfm output.report=; }
check "reference" picture

# stopped RANK-FROM-1 OVERRIDE...: the farm on 3 processes, of which one is stopped in the midst.
stopped() {
    nth=$1; shift
    rm -f t.pfm
    timeout 100 "$MPIEXEC" -n 3 "$FARM" "$SCENE" sampling.samples=400 image.width=160 \
        image.height=120 output.image=t.pfm output.report=t.json "$@" >out.txt 2>err.txt &
    guard=$!
    victim=
    for i in $(seq 200); do
        sleep 0.02
        mpi=$(pgrep -P $guard | head -n 1)
        [ -n "$mpi" ] && victim=$(ranks_of "$mpi" | sed -n "${nth}p")
        [ -n "$victim" ] || continue
        # Ticks of user time: it renders, for starting takes less.
        [ "$(awk '{ print ($14 >= 10) }' "/proc/$victim/stat")" = 1 ] && break
    done
    kill -STOP "$victim" || return 1
    wait $guard
    status=$?
    kill -KILL "$victim" 2>/dev/null
    cat out.txt err.txt
    [ $status -eq 0 ] && cmp reference.pfm t.pfm
}
check "a stopped renderer" stopped 2
finish
