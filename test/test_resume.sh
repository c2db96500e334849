# The journal: however a run was ended, the same command continues it, and gives the same picture in the end.
. test/resume.sh
SIZE="image.width=320 image.height=336 sampling.samples=8 farm.tile=16"
check "an uninterrupted run" whole

# A journal that holds a good part of the picture, which is 1.3 MB.
killed() { broken_off 9 900000 "$@" && [ ! -e a.pfm ]; } # PROCESSES ARGUMENT...
cp_journal() { killed 0 && cp a.journal kept; }
check "a run that was killed leaves a journal" cp_journal

goes_on_from() { # KEPT PROCESSES ARGUMENT...
    kept=$1 n=$2; shift 2
    resume_from "$kept"
    run 0 farm_n "$n" "$SCENE" $SIZE output.image=a.pfm "$@" && cat "$T/err" &&
        grep -q 'going on with a.journal: [1-9]' "$T/err" && finished &&
        grep -A 1 '"resumed"' a.json | grep -q '"tiles": [1-9]'
}
goes_on() { goes_on_from kept "$@"; }
check "the same command goes on" goes_on 0
records=$(resumed records)
check "on three processes" goes_on 3
check "with larger tiles" goes_on 0 farm.tile=48
cyclic() { # of what there is some is of use
    goes_on 2 farm.schedule=cyclic && grep -q '"seconds_repeated": [0-9.]*[1-9]' a.json &&
        sed -n 's/.*journal: \([0-9.]*\) % of the pixels, but \([0-9.]*\) %.*/\1 \2/p' "$T/err" |
        awk '{ again = $2 < $1 } END { exit !again }'
}
check "cyclic" cyclic

# A disk without room for the rest: nothing is rendered, and the journal of the earlier run stays, that of another
# picture (of 65 samples) in its place.
cat >refuses <<'END'
mount -t tmpfs -o size=1m none small && cp crowded small/a.journal || exit 1
"$@" output.journal=small/a.journal
[ $? -eq 2 ] && cmp crowded small/a.journal || exit 1
"$@" output.journal=small/a.journal sampling.samples=65
[ $? -eq 2 ] && cmp crowded small/a.journal && [ ! -e small/a.journal.1 ] && rm small/a.journal || exit 1
"$@" output.journal=small/a.journal
[ $? -eq 2 ] && [ ! -e small/a.journal ]
END
small_disk() (
    SIZE="image.width=640 image.height=480 sampling.samples=64 farm.tile=16"
    broken_off 9 100000 0 && mv a.journal crowded && [ "$(stat -c %s crowded)" -lt 900000 ] || return 1
    unshare --mount sh refuses timeout 60 "$FARM" "$SCENE" $SIZE output.image=a.pfm 2>e
    status=$?
    cat e
    [ $status -eq 0 ] && [ "$(grep -c 'but the disk has only' e)" -eq 3 ]
)
mkdir small
if unshare --mount mount -t tmpfs none small 2>/dev/null; then check "no room for the rest of a journal" small_disk
else count=$((count + 1)); echo "not ok $count - no room for the rest of a journal # SKIP nothing can be mounted"; fi

# Tiles that are rendered again count only once in the error. It is that of an uninterrupted run if bands end where
# tiles end (three strips of 7 rows of tiles: 336 pixels), and about that if tiles are used in part. true_rmse shows
# that the picture is complete.
rmse() { sed -n 's/.*"estimated_rmse": \([0-9.e-]*\).*/\1/p' "$1" | tail -n 1; }
error_once() { # TOLERANCE KEPT PROCESSES ARGUMENT...
    tolerance=$1 saved=$2; shift 2
    goes_on_from "$saved" "$@" sampling.reference=whole.pfm || return 1
    sed -n '/"error": \[/,/\]/p' a.json | tail -n 3
    grep -q '"true_rmse": 0[,}.]' a.json &&
        awk "BEGIN { r = $(rmse a.json) / $(rmse whole.json) - 1; print r; exit !(r * r < $tolerance ^ 2) }"
}
# A journal of expensive tiles, which come first, so that the tiles rendered again are unlike the others.
broken_off 9 500000 0 && cp a.journal half
check "in strips, the error counts each pixel once" error_once 1e-3 half 3 farm.schedule=strips
check "with smaller tiles, and tiles in part" error_once 0.05 kept 3 farm.tile=5
check "with other instructions" goes_on 0 farm.kernel=portable farm.variant=full

mpiexec_goes_on() { killed 2 farm.master_renders=no &&
    run 0 farm_n 2 "$SCENE" $SIZE output.image=a.pfm && finished; }
check "mpiexec was killed" mpiexec_goes_on

check "a cut tail" cut_tail 100 kept
in_the_middle() { # PROCESSES: three bytes are in one record, or in two
    flipped 100000 "$1" kept && resumed records &&
        [ "$(resumed records)" -lt "$records" ] && [ "$(resumed records)" -ge $((records - 2)) ]
}
check "damage in the middle" in_the_middle 0
check "damage in the middle, on three processes" in_the_middle 3
check "damage that was there before" damaged_once 100000 kept
check "nothing left to render" all_saved kept
# Ranks that share a core take turns, so the time that is saved is not the sum of their wall times.
turns_saved() {
    core=$(taskset -pc $$ | sed 's/.*: //; s/[-,].*//')
    rm -f a.*
    begun=$(date +%s.%N)
    run 1 timeout 60 taskset -c "$core" "$MPIEXEC" -n 6 "$FARM" "$SCENE" $SIZE output.image=a.pfm \
        output.report=/dev/full ||
        return 1
    ended=$(date +%s.%N)
    rm a.pfm
    run 0 farm_n 0 "$SCENE" $SIZE output.image=a.pfm && finished || return 1
    spared=$(tr '\n' ' ' <"$T/out" | sed -n 's/.* and \([0-9.]*\) s of an earlier run.*/\1/p')
    echo "saved: $spared s, the earlier run took $ended - $begun s"
    awk "BEGIN { exit !($spared > 0 && $spared < $ended - $begun) }"
}
check "what ranks that share a core have saved" turns_saved

other() { # ARGUMENT...: another picture's journal is set aside
    resume_from kept
    run 0 farm_n 0 "$SCENE" $SIZE output.image=a.pfm "$@" && echo "$err" | grep -q 'is now called a.journal.1' &&
        cmp kept a.journal.1 && [ ! -e a.journal ] && ! cmp -s whole.pfm a.pfm
}
check "other settings" other sampling.samples=2
check "another region" other "image.region=3 0 310 320" sampling.samples=1
check "not a journal" sh -c 'rm -f a.*; echo "my diary" >a.journal
    "$1" "$2" image.width=32 output.image=a.pfm 2>e >o && grep -q "now called a.journal.1" e &&
    [ "$(cat a.journal.1)" = "my diary" ]' - "$FARM" "$SCENE"
without() {
    rm -f a.*
    run 0 farm_n 0 "$SCENE" $SIZE output.image=a.pfm output.journal= && cmp whole.pfm a.pfm && [ ! -e a.journal ]
}
check "no journal" without
twice() { # a second run of the same picture while one is at work
    rm -f a.*
    "$FARM" "$SCENE" $SIZE sampling.samples=400 output.image=a.pfm >o 2>e & pid=$!
    i=0 # what is written to is locked
    while ! [ -s a.journal ] && [ $i -lt 600 ]; do sleep 0.05; i=$((i + 1)); done
    run 2 farm_n 0 "$SCENE" $SIZE sampling.samples=400 output.image=a.pfm; status=$?
    kill -9 $pid; wait $pid 2>/dev/null
    [ $status -eq 0 ] && echo "$err" | grep -q 'another run is at work'
}
check "two runs at a time" twice
wrong_name() { run 2 "$FARM" "$SCENE" output.journal=x.png && echo "$err" | grep -q '\.journal'; }
check "a journal has its own extension" wrong_name

gone() { # the folder is removed in the middle: the tiles are kept elsewhere
    rm -rf a.* there saved; mkdir there saved
    (cd saved && TMPDIR=$T/saved exec "$FARM" "$SCENE" $SIZE output.image=../there/a.pfm >../o 2>../e) & pid=$!
    i=0
    while [ "$(stat -c %s there/a.journal 2>/dev/null || echo 0)" -lt 100000 ] && [ $i -lt 600 ]; do
        sleep 0.05; i=$((i + 1))
    done
    rm -r there; wait $pid
    status=$?
    cat e
    [ $status -eq 1 ] && grep -q 'cannot write' e || return 1
    command=$(sed -n 's/.*without rendering it again: //p' e)
    mkdir there
    (cd saved && eval "$command") >o 2>e || { cat e; return 1; }
    cmp whole.pfm there/a.pfm && grep -q '"primary": 0,' there/a.json
}
check "the folder is removed" gone
finish
