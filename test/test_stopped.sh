# A rank that is stopped keeps the others neither from finishing the picture nor from exiting.
. test/lib.sh
STOP=$(realpath -q "${FAULTS_STOP:-/nowhere}")
cd "$T" || exit 1
SCENE=$CONFIG/hello.ini

picture() { run 0 farm_n 2 "$SCENE" sampling.samples=200 image.width=160 image.height=120 \
    output.image=reference.pfm output.report=; }
check "reference" picture

[ -e "$STOP" ] || { echo "not ok 2 - a rank that stops # SKIP without bench/faults_stop.so"; finish; }

# stops STATUS AT PROCESSES OVERRIDE...: a run whose rank 1 is stopped at the step AT (bench/faults_stop.c).
stops() {
    want=$1 at=$2 processes=$3; shift 3
    rm -f t.pfm t.json t.journal note
    FAULTS_STOP_RANK=1 FAULTS_STOP_AT=$at FAULTS_STOP_NOTE=note timeout -k 1 100 "$MPIEXEC" \
        -n "$processes" env LD_PRELOAD="$STOP" ASAN_OPTIONS="verify_asan_link_order=0:${ASAN_OPTIONS:-}" \
        "$FARM" "$SCENE" sampling.samples=200 image.width=160 image.height=120 output.image=t.pfm \
        farm.patience=2 "$@" >out.txt 2>err.txt
    got=$?
    cat out.txt err.txt
    { kill -KILL "$(cat note)"; } 2>/dev/null
    [ -e note ] && [ "$got" -eq "$want" ]
}
# noted SECONDS: waits until the rank stops, or this script has ended; looks that often.
noted() { while kill -0 $$ 2>/dev/null && [ ! -s note ]; do sleep "$1"; done; [ -s note ]; }
# Rank 1 must be named in a message and in the report.
named() { grep -q '^farm: warning: rank 1 on .* answers no more' err.txt && grep -q '"rank": 1,.*"silent": 1' t.json; }
renderer() { stops 0 tile 3 && cmp reference.pfm t.pfm && named; }
check "a stopped renderer" renderer
before() {
    stops 75 share 3 && grep -q "^farm: not all processes have come to the start" err.txt && [ ! -e t.journal ]
}
check "a rank that stops before it has the scene" before
memory() { stops 75 memory 3 && grep -q "^farm: not all processes have come to the start" err.txt; }
check "before it has opened the memory of its node" memory
# The launcher must end the stopped rank.
early() {
    for try in 1 2 3; do # what rank 0 leaves with got lost in every second run
        rm -f note
        { noted 0.1 && sleep 0.5 && pkill -TERM -P "$(pgrep -P $$ -x timeout)"; } &
        stops 75 share 3 farm.patience=60 &&
            grep -q "^farm: stopped before rendering had begun" err.txt && [ ! -e t.journal ] || return 1
    done
}
check "a signal at that time" early
share() { stops 0 tile 3 farm.schedule=strips && cmp reference.pfm t.pfm && named; }
check "a stopped renderer's strip goes to the others" share
square() { stops 0 tile 3 farm.schedule=tiles farm.tile=32 && cmp reference.pfm t.pfm && named; }
check "and its tiles" square
behind() { stops 0 later 3 && cmp reference.pfm t.pfm; }
check "a renderer that has left results" behind
# All tiles are too large for a slot of a tray.
message() {
    set -- sampling.samples=50 image.width=128 image.height=192
    run 0 farm_n 2 "$SCENE" "$@" output.image=large.pfm output.report= &&
        stops 0 result 3 "$@" farm.schedule=tiles farm.tile=64 && cmp large.pfm t.pfm
}
check "a renderer that sends a message" message
# The stopped rank is continued before it is given up, or after that: then the results in its tray are taken, or of no
# use.
goes_on() { # SECONDS
    rm -f note # of an earlier run
    { noted 0.05 && sleep "$1" && kill -CONT "$(cat note)"; } &
    stops 0 later 3 farm.patience=1 sampling.samples=1000 && cmp longer.pfm t.pfm
}
longer() { run 0 farm_n 2 "$SCENE" sampling.samples=1000 image.width=160 image.height=120 \
    output.image=longer.pfm output.report=; }
check "a longer picture" longer
# The master must wait for at most five seconds from the last sign of life that it asked the rank for, not from the last
# tile. These seconds must not count in the elapsed time of the error.
waiting() {
    awk '
        /"[a-z]*_s": / { split($0, part, /[:,]/); gsub(/[ "]/, "", part[1])
            if (!(part[1] in of)) of[part[1]] = part[2] + 0 }
        /"elapsed_s": / { sub(/.*"elapsed_s": /, ""); told = $0 + 0 }
        END {
            before = of["init_s"] + of["load_s"] + of["broadcast_s"] + of["build_s"]
            print "# told after", told, "of", before, "+", of["render_s"], "in", of["total_s"]
            exit told <= 0 || told - before - of["render_s"] > 0.5 || of["total_s"] - told >= 5
        }' t.json
}
waited() { stops 0 tile 3 farm.patience=1 sampling.samples=1000 && cmp longer.pfm t.pfm && waiting; }
check "how long it was waited for" waited
in_time() { goes_on 0.3 && ! named; }
check "it goes on in time" in_time
check "it goes on late" goes_on 1.5
alone() { # before it has finished anything
    stops 75 tile 2 farm.master_renders=no && grep -q "no renderer answers any more" err.txt && [ -e t.pfm ] &&
        grep -q "nothing is saved yet; to begin again: " err.txt && [ ! -e t.journal ]
}
check "nobody is left who renders" alone
other() { stops 0 tile 3 farm.master_renders=no farm.patience=1 && cmp reference.pfm t.pfm && named; }
check "one of two is left who renders" other
late() { stops 0 exit 3 && cmp reference.pfm t.pfm; }
check "a rank that stops when all is done" late
finish
