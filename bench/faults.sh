# faults.sh RUNS [SEED] [FOLDER FOR TABLES]: injects faults into runs and checks the consequences. Kinds of faults:
#
#   rank, master, mpiexec, alone   kill -9 of a rank, of rank 0, of mpiexec, of a run without it
#   stop       SIGSTOP of a rank: the picture must be finished without it
#   moment     the same at a certain step, from before it has the scene to its last one (by the library FAULTS_STOP,
#              LD_PRELOAD); status 75 if it has not reported for work yet
#   signal     SIGTERM, SIGINT or SIGUSR1: status 75, or 0 with the picture if it was complete already
#   torn, flipped                  mpiexec killed, then the journal truncated, or one of its bits inverted
#   full       a file system that is too small, then one with room (if none can be mounted: torn, with a message)
#   slow       a slow disk (by the library FAULTS_SLOW, LD_PRELOAD), and a kill
#   none       a run without a fault
#
# After the fault the same picture is rendered again, on another number of processes, with another schedule and tile
# size. FARM, MPIEXEC, FAULTS_JOURNAL, FAULTS_SLOW and FAULTS_STOP are paths of programs and libraries. FAULTS_KINDS
# selects kinds. FAULTS_LIMIT is the most seconds that a run may take, FAULTS_LEFT (10) the most seconds that its
# processes may be there after it. The number of samples is chosen such that two processes render for FAULTS_SECONDS
# (4), as a journal has tiles only after its first second. FAULTS_SIZE: settings of another picture. Faults are injected
# in the first FAULTS_UNTIL (1) of the time that a run takes, except those that wait for the first tile in the journal.
# After FAULTS_PATIENCE seconds (10) a stopped rank is given up. A fault counts as injected if it has hit a process or a
# journal. It counts as missed if the run was over before, the process was not found, or the journal had no tile to be
# torn. Status 1 if anything was lost, differed, hung or was left behind.
set -u
export LC_ALL=C # figures with a decimal point
. "$(dirname "$0")/report.sh"
runs=${1:-300} state=${2:-1} out=${3:-}
[ "$runs" -gt 0 ] || { echo "faults.sh: expected a number of runs, not $runs" >&2; exit 2; }
FARM=$(realpath "${FARM:-./farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
JOURNAL=$(realpath "${FAULTS_JOURNAL:-build/bench/faults_journal}")
SLOW=$(realpath "${FAULTS_SLOW:-build/bench/faults_slow.so}")
STOP=$(realpath "${FAULTS_STOP:-build/bench/faults_stop.so}")
SCENE=$(realpath test/data/everything.ini)
PICTURE="image.width=256 image.height=256"
SIZE=${FAULTS_SIZE:-$PICTURE sampling.samples=16}
kinds=${FAULTS_KINDS:-rank stop master none mpiexec signal torn alone flipped moment full slow}
T=$(mktemp -d)
mark= # of what is running
# Stopped ranks would never end by themselves.
clean_up() {
    for p in $(marked); do kill -9 "$p"; done
    umount "$T/small" 2>/dev/null
    rm -rf "$T"
}
trap clean_up EXIT
trap 'exit 1' INT TERM
[ -z "$out" ] || out=$(realpath "$out")
cd "$T" || exit 1
# Links with names without blanks, at which LD_PRELOAD would end.
ln -s "$SLOW" slow.so && ln -s "$STOP" stop.so || exit 1
LIMIT=${FAULTS_LIMIT:-120} # seconds until a run counts as hung
LEFT=${FAULTS_LEFT:-10}
PATIENCE=farm.patience=${FAULTS_PATIENCE:-10}
JOURNAL_START=24 # bytes of a journal before its first tile

# Pseudorandom numbers below $1, the same for the same seed (C. E. Haynes' multiplier).
number=0
pick() {
    state=$(((state * 6364136223846793005 + 1442695040888963407) & 0x7fffffffffffffff))
    number=$(((state >> 33) % $1))
}
nap() { sleep "$(awk "BEGIN { print $1 / 1000 }")"; }

# The processes of this run, which have a mark in their environment. Zombies have none.
marked() {
    [ -n "$mark" ] || return
    grep -lzx "FARM_FAULT=$mark" /proc/[0-9]*/environ 2>/dev/null | sed 's,/proc/\([0-9]*\)/.*,\1,'
}
rank_pid() {
    for p in $(marked); do
        { tr "\0" "\n" <"/proc/$p/environ"; } 2>/dev/null | grep -qx "PMI_RANK=$1" &&
            [ "$(cat "/proc/$p/comm" 2>/dev/null)" = farm ] && echo "$p"
    done
}
# Shared memory that was created since $before and that no process has open.
segments() { ls /dev/shm 2>/dev/null | sort; }
orphans() {
    for segment in $(segments); do
        echo "$before" | grep -qx "$segment" && continue
        [ -d "/dev/shm/$segment" ] && continue
        grep -qs "/dev/shm/$segment" /proc/[0-9]*/maps && continue
        ls -l /proc/[0-9]*/fd 2>/dev/null | grep -q "/dev/shm/$segment" && continue
        echo "$segment"
    done
}

# start PROCESSES ARGUMENT...: starts the farm in the background, as $job
start() {
    count=$1; shift
    # shellcheck disable=SC2086 # a list of settings
    if [ "$count" -eq 0 ]; then
        FARM_FAULT=$mark ${PRELOAD:+env LD_PRELOAD=$PRELOAD} "$FARM" "$SCENE" $SIZE "$@" >o 2>e &
    else
        FARM_FAULT=$mark env --default-signal=INT "$MPIEXEC" -n "$count" ${PRELOAD:+env LD_PRELOAD=$PRELOAD} \
            "$FARM" "$SCENE" $SIZE "$@" >o 2>e &
    fi
    job=$!
}

# Waits for the job and all its processes. status: that of the job, or 124 if it had to be killed.
hung=0 left=0
finish() {
    i=0
    while kill -0 $job 2>/dev/null && [ $i -lt $((LIMIT * 20)) ]; do nap 50; i=$((i + 1)); done
    if kill -0 $job 2>/dev/null; then
        hung=$((hung + 1)) status=124
        kill -9 $job
        wait $job 2>/dev/null
    else
        wait $job 2>/dev/null
        status=$?
    fi
    # mpiexec's processes notice within moments that it is gone.
    i=0
    while [ -n "$(marked)" ] && [ $i -lt $((LEFT * 20)) ]; do nap 50; i=$((i + 1)); done
    for p in $(marked); do left=$((left + 1)); kill -9 "$p"; done
}

unmount() { # a process that was killed may take a moment to let go
    i=0
    until umount small; do [ $i -lt 40 ] || exit 1; nap 50; i=$((i + 1)); done
}

has_tile() { [ "$(stat -c %s a.journal 2>/dev/null || echo 0)" -gt "$JOURNAL_START" ]; }
await_tile() {
    i=0
    while kill -0 $job 2>/dev/null && ! has_tile && [ $i -lt 1000 ]; do nap 20; i=$((i + 1)); done
}

# strike SIGNAL PROCESS: injects the fault; clears hit if the process no longer exists.
strike() { { [ -n "$2" ] && kill "-$1" "$2"; } 2>/dev/null || hit=; }

other_way() { # chooses processes and settings that do not change the picture
    pick 7; n=$((number + 2))
    pick 4
    case $number in
    0) way=farm.schedule=tiles ;;
    1) way=farm.schedule=strips ;;
    2) way=farm.schedule=cyclic ;;
    *) way=farm.schedule=dynamic ;;
    esac
    pick 3; [ "$number" -gt 0 ] || way="$way farm.tile=24"
}

# samples_for SECONDS: the number of samples per pixel with which rendering takes FAULTS_SECONDS if it takes SECONDS
# with 16; at least 16, at most 65536. SECONDS are CPU seconds: with wall seconds of a busy moment, runs would be too
# short for their faults.
samples_for() {
    awk -v seconds="${1:-0}" -v wanted="${FAULTS_SECONDS:-4}" 'BEGIN {
        n = seconds > 0 ? int(16 * wanted / seconds) : 16
        print (n < 16 ? 16 : n > 65536 ? 65536 : n) }'
}

# choose_kind RUN: sets kind, in turns.
choose_kind() {
    turn=$1
    # shellcheck disable=SC2086 # a list of kinds
    set -- $kinds
    shift $(((turn - 1) % $#)); kind=$1
    [ "$kind" = full ] && [ -z "$small" ] && kind=torn
}

# What the kind of fault needs before the run starts: other processes or settings, a library, a small file system.
prepare_fault() {
    case $kind in
    alone) n=0 ;;
    stop) way="$way $PATIENCE" ;;
    moment) PRELOAD=./stop.so way="$way $PATIENCE"
        pick 8; set -- share memory ready tile later stats finalize exit; shift $number
        export FAULTS_STOP_AT=$1 FAULTS_STOP_NOTE=note
        pick $((n - 1)); export FAULTS_STOP_RANK=$((number + 1)) ;;
    slow) PRELOAD=./slow.so ;;
    full) pick 60; target=small/a.pfm
        mount -t tmpfs -o size=$((40 + 20 * number))k none small || exit 1 ;;
    esac
}

# Injects the fault into the job. Sets expected: the status that the job must end with; empty: any.
inject_fault() {
    case $kind in
    none | full | moment) ;;
    *) nap "$when" ;;
    esac
    case $kind in
    none) expected=0 ;;
    full) ;;
    moment) expected=0
        case $FAULTS_STOP_AT in share | memory) expected=75 ;; esac ;;
    rank | stop)
        pick $((n - 1)); victim=$((number + 1))
        await_tile # the ranks have begun to render then
        if [ $kind = rank ]; then strike 9 "$(rank_pid $victim)"
        else nap 300; expected=0; strike STOP "$(rank_pid $victim)"; fi ;;
    master) strike 9 "$(rank_pid 0)" ;;
    torn | flipped) await_tile; strike 9 $job ;;
    mpiexec | alone | slow) strike 9 $job ;;
    signal) expected=75
        pick 3; case $number in 0) s=TERM ;; 1) s=INT ;; *) s=USR1 ;; esac
        strike $s $job ;;
    esac
}

# Sets hit when the job has ended: whether the fault was injected, no or - (no fault); corrects expected.
see_hit() {
    case $kind in
    moment) [ -s note ] || hit='' expected=0 ;;
    torn | flipped) has_tile || hit= ;;
    full) [ $first -ne 0 ] || grep -q 'No space left' e || hit= ;;
    signal) # mpiexec ends ranks that have not come together yet with a status of its own
        if [ $first -eq 0 ] && [ -s a.pfm ] && [ ! -e a.journal ]; then expected=0
        elif [ ! -e a.journal ] && [ ! -s a.pfm ]; then expected=; fi ;;
    esac
    if [ $kind = none ]; then hit=-
    elif [ -n "$hit" ]; then injected=$((injected + 1))
    else hit=no missed=$((missed + 1)); fi
}

# A rank that is killed while it starts cannot remove a segment that it has just made, and no other process knows whose
# it was. So such segments are counted separately. The kinds of the first case kill nobody.
count_segments() {
    number=$(orphans | wc -l)
    case $kind in
    none | signal | full) kept=$((kept + number)) ;;
    *) orphaned=$((orphaned + number)) ;;
    esac
}

# Takes what is in the small file system out of it, as if space had been made.
release_small() {
    mv small/a.* . 2>/dev/null
    for j in a-*.journal; do [ -e "$j" ] && mv "$j" a.journal; done # what could not stay there
    unmount
}

# Damages the journal, if there is one and the kind of fault does so. Sets records: the tiles that it holds afterwards.
spoil_journal() {
    records=0
    [ -s a.journal ] || return 0
    case $kind in
    torn) pick 1000000000; records=$("$JOURNAL" tear a.journal $number) ;;
    flipped) pick 1000000000; records=$("$JOURNAL" flip a.journal $number) ;;
    *) records=$("$JOURNAL" count a.journal) ;;
    esac
}

# Renders the picture again, in another way, from the journal if there is one.
go_on() {
    other_way; pick 4; [ "$number" -gt 0 ] || n=0
    PRELOAD=
    # shellcheck disable=SC2086
    start $n output.image=a.pfm $way
    finish
    [ $status -eq 0 ] || { wrong=$((wrong + 1)); cp e "wrong.$run"; }
    taken=$(of a.json resumed records) s=$(of a.json resumed seconds_saved) again=$(of a.json resumed seconds_repeated)
    taken=${taken:-0} s=${s:-0} again=${again:-0}
    # The record with the inverted bit may be an incomplete one, which is lost anyway.
    [ "$taken" -ge "$records" ] || lost=$((lost + records - taken))
}

if [ -z "${FAULTS_SIZE:-}" ]; then
    mark=$$.samples
    start 2 output.image=ref.pfm output.report=ref.json output.journal=; finish
    seconds=$(sed -n 's/.*"rank".*"cpu_s": \([0-9.]*\),.*/\1/p' ref.json 2>/dev/null | sort -n | tail -n 1)
    SIZE="$PICTURE sampling.samples=$(samples_for "$seconds")"
    rm -f ref.pfm
fi

mark=$$.0
start 2 output.image=ref.pfm output.journal=
begin=$(date +%s%N); finish
span=$((($(date +%s%N) - begin) / 1000000)) # milliseconds that a run takes here
latest=$(awk "BEGIN { print int(${FAULTS_UNTIL:-1} * $span) }")
[ -s ref.pfm ] || { cat e; exit 1; }
small=yes; mkdir small || exit 1
mount -t tmpfs -o size=64k none small 2>/dev/null || small=
[ -z "$small" ] || umount small || exit 1
case "$small, $kinds " in
,*" full "*) echo "faults.sh: no file system can be mounted here: torn in place of full" >&2 ;;
esac
injected=0 missed=0 lost=0 kept=0 orphaned=0 differ=0 wrong=0 repeated=0 saved=0 run=0
echo "run,kind,processes,way,fault_ms,status,records,taken_over,seconds_saved,seconds_repeated,same,injected" >table.csv

while [ $run -lt "$runs" ]; do
    run=$((run + 1)) mark=$$.$run
    choose_kind $run
    rm -f a.* a-*.journal o e note; other_way; PRELOAD=
    pick $((latest - span / 4)); when=$((span / 4 + number))
    expected= target=a.pfm hit=yes # whether the fault was injected
    prepare_fault
    before=$(segments)
    # shellcheck disable=SC2086
    start $n output.image=$target $way
    first_way=$way processes=$n
    inject_fault
    finish
    first=$status
    unset FAULTS_STOP_AT FAULTS_STOP_RANK
    see_hit
    count_segments
    [ -z "$expected" ] || [ "$status" -eq "$expected" ] || { wrong=$((wrong + 1)); cp e "wrong.$run"; }
    taken=0 s=0 again=0
    [ $kind != full ] || release_small
    spoil_journal
    # A run that was stopped before it had a tile leaves the picture so far, but no journal.
    if [ ! -s a.pfm ] || [ -e a.journal ] || [ "$first" -eq 75 ]; then go_on; fi
    same=yes
    cmp -s ref.pfm a.pfm || { same=no differ=$((differ + 1)); }
    echo "$run,$kind,$processes,$first_way,$when,$first,$records,$taken,$s,$again,$same,$hit" >>table.csv
    repeated=$(awk "BEGIN { print $repeated + $again }") saved=$(awk "BEGIN { print $saved + $s }")
done

{
    echo "| runs | faults injected | faults missed | tiles lost | pictures that differ | hangs | processes left |" \
        "segments left | segments of the killed | other statuses | seconds saved | seconds repeated |"
    echo "|---|---|---|---|---|---|---|---|---|---|---|---|"
    echo "| $runs | $injected | $missed | $lost | $differ | $hung | $left |" \
        "$kept | $orphaned | $wrong | $saved | $repeated |"
    echo
    echo "| kind | runs | faults injected | records at the fault, mean | taken over, mean | pictures the same |"
    echo "|---|---|---|---|---|---|"
    awk -F, 'NR > 1 { n[$2]++; r[$2] += $7; t[$2] += $8; s[$2] += $11 == "yes"; h[$2] += $12 == "yes" }
        END {
            for (k in n)
                printf "| %s | %d | %d | %.1f | %.1f | %d |\n", k, n[k], h[k], r[k] / n[k], t[k] / n[k], s[k]
        }' table.csv | sort
} >table.md
cat table.md
for log in wrong.*; do [ -e "$log" ] && { echo "run ${log#wrong.}:"; cat "$log"; }; done
if [ -n "$out" ]; then cp table.csv "$out/faults.csv"; cp table.md "$out/faults.md"; fi
[ $((lost + differ + hung + left + kept + wrong)) -eq 0 ]
