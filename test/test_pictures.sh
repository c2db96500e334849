# The picture is the same, bit for bit, for any number of processes, schedule and tile size.
. test/lib.sh
NODES=$(realpath -q "${NODES:-/nowhere}")
cd "$T" || exit 1
SCENE=$DATA/everything.ini

render() { # PICTURE N OVERRIDE...
    picture=$1 n=$2; shift 2
    run 0 farm_n "$n" "$SCENE" output.image="$picture" output.report= "$@"
}

check "reference, without mpiexec" render reference.pfm 0
for n in 1 2 3 5; do
    for how in "farm.tile=8" "farm.tile=17" "farm.tile=64" "farm.schedule=tiles" \
               "farm.schedule=strips" "farm.schedule=cyclic" "farm.schedule=cyclic-rows" \
               "farm.tile=auto"; do
        same() { render "t.pfm" "$n" "$how" && cmp reference.pfm t.pfm; }
        check "-n $n $how" same
    done
done
for schedule in dynamic tiles strips cyclic cyclic-rows; do
    same() {
        render t.pfm 3 farm.schedule=$schedule farm.master_renders=no && cmp reference.pfm t.pfm
    }
    check "rank 0 only serves, $schedule" same
done
same() { render t.pfm 0 farm.tile=1 && cmp reference.pfm t.pfm; }
check "tiles of one pixel" same
same() {
    render few.pfm 0 image.region="0 0 3 2" && render t.pfm 5 farm.tile=64 image.region="0 0 3 2" &&
        cmp few.pfm t.pfm
}
check "more processes than tiles" same
same() { render t.pfm 44 && cmp reference.pfm t.pfm; }
check "as many as in the paper" same

# Where processes may not read each other's memory, MPICH moves messages longer than 8 KB in pieces, and short messages
# overtake them: a tile may come back before the notice that it takes long.
dear() {
    run 0 farm_n "$2" "$CONFIG/lantern.ini" sampling.samples=4 output.image="$1" output.report= \
        farm.master_renders="$3"
}
overtaken() {
    dear dear.pfm 0 yes || return 1
    for i in 1 2 3; do
        UCX_TLS=posix,sysv,self dear t.pfm 3 no && cmp dear.pfm t.pfm || return 1
    done
}
check "messages that overtake each other" overtaken

check "5 samples, without mpiexec" render s0.pfm 0 sampling.samples=5
for how in "farm.tile=8" "farm.schedule=strips" "farm.schedule=cyclic"; do
    same() { render t.pfm 3 sampling.samples=5 "$how" && cmp s0.pfm t.pfm; }
    check "5 samples, $how" same
done

# A region has the same bytes as that part of the whole picture. A PFM has the header "PF\nW H\n-1.0\n" and then rows
# from the bottom up.
region_rows() {
    render part.pfm 2 image.region="0 20 97 11" || return 1
    tail -c $((97 * 11 * 12)) part.pfm >part.raw
    tail -c $((97 * 61 * 12)) reference.pfm | tail -c +$((97 * 12 * 30 + 1)) |
        head -c $((97 * 11 * 12)) >whole.raw
    cmp part.raw whole.raw
}
check "a region equals that part of the picture" region_rows

for extension in png hdr; do
    same() {
        render "a.$extension" 0 && render "b.$extension" 3 farm.schedule=cyclic &&
            cmp "a.$extension" "b.$extension"
    }
    check "$extension files are identical too" same
done

# nodes NUMBER OPENED OVERRIDE...: a run on NUMBER simulated nodes (test/several_nodes.c), each with its own scene,
# which exchange messages instead of sharing memory. OPENED: how often shared memory must be opened: twice by each rank
# that is not the first of its node, to test whether it can and to map it. A rank alone on its node shares no memory.
nodes() {
    number=$1 opened=$2; shift 2
    rm -f note t.pfm
    SEVERAL_NODES=$number SEVERAL_NODES_NOTE=note run 0 timeout 60 "$MPIEXEC" -n 5 env LD_PRELOAD="$NODES" \
        ASAN_OPTIONS="verify_asan_link_order=0:${ASAN_OPTIONS:-}" \
        "$FARM" "$SCENE" output.image=t.pfm output.report= "$@" || return 1
    touch note
    [ "$(wc -c <note)" -eq "$opened" ] && cmp reference.pfm t.pfm
}
[ -e "$NODES" ] || { echo "not ok $((count + 1)) - nodes # SKIP without test/several_nodes.so"; finish; }
for schedule in dynamic cyclic; do
    check "one node, $schedule" nodes 1 8 farm.schedule=$schedule
    check "each rank on a node of its own, $schedule" nodes 5 0 farm.schedule=$schedule
    check "every other one, $schedule" nodes 2 6 farm.schedule=$schedule
    check "two ranks on one of four nodes, $schedule" nodes 4 2 farm.schedule=$schedule
    check "rank 0 only serves, $schedule" nodes 3 4 farm.schedule=$schedule farm.master_renders=no
    network() { MPIR_CVAR_NOLOCAL=1 nodes 5 0 farm.schedule=$schedule; }
    check "messages over the network path of MPI, $schedule" network
done
# The three other ranks then test once more whether they can open the memory.
refused() {
    SEVERAL_NODES_REFUSED=2 nodes 1 9 && grep -q '^farm: 1 of 5 processes can share no memory' "$T/err"
}
check "a rank that may not open the others' memory" refused
finish
