# The journal under adaptive sampling: a run that was ended in any pass goes on there, with the same
# picture in the end.
. test/lib.sh
cd "$T" || exit 1
SCENE=$DATA/everything.ini
SIZE="image.width=240 image.height=240 sampling.target_error=0.001"

farm_n 0 "$SCENE" $SIZE output.image=whole.pfm output.report=whole.json >/dev/null 2>&1
finished() { cmp whole.pfm a.pfm && [ ! -e a.journal ]; }
passes_of() { sed -n 's/^ *"passes": \([0-9]*\),$/\1/p' "$1"; }

# Ended when its journal has grown so far: SIGNAL BYTES PROCESSES ARGUMENT...
broken_off() {
    signal=$1 bytes=$2 processes=$3; shift 3
    rm -f a.*
    if [ "$processes" -eq 0 ]; then "$FARM" "$SCENE" $SIZE output.image=a.pfm "$@" >o 2>e &
    else "$MPIEXEC" -n "$processes" "$FARM" "$SCENE" $SIZE output.image=a.pfm "$@" >o 2>e & fi
    pid=$!
    i=0
    while [ "$(stat -c %s a.journal 2>/dev/null || echo 0)" -lt "$bytes" ] && [ $i -lt 600 ]; do
        sleep 0.05; i=$((i + 1))
    done
    kill -"$signal" $pid; wait $pid 2>/dev/null
    status=$?
    # mpiexec's processes end when they see that it has gone.
    i=0
    while ! flock -n a.journal true && [ $i -lt 100 ]; do sleep 0.05; i=$((i + 1)); done
    [ -s a.journal ]
}
# 57,600 pixels with 28 bytes each in the first pass.
first() { broken_off 9 800000 0 && cp a.journal first; }
check "killed in the first pass" first
later() { broken_off 9 2300000 0 && cp a.journal later; }
check "killed in a later pass" later

goes_on() { # KEPT PROCESSES ARGUMENT...
    kept=$1 n=$2; shift 2
    rm -f a.*; cp "$kept" a.journal
    run 0 farm_n "$n" "$SCENE" $SIZE output.image=a.pfm "$@" && cat "$T/err" &&
        grep -q 'going on with a.journal in pass [1-9]' "$T/err" && finished &&
        grep -A 1 '"resumed"' a.json | grep -q '"tiles": [1-9]' &&
        [ "$(passes_of a.json)" = "$(passes_of whole.json)" ]
}
check "first: with smaller tiles" goes_on first 2 farm.tile=5
check "later: the same command goes on" goes_on later 0
check "later: on three processes, with larger tiles" goes_on later 3 farm.tile=48
check "in a later pass" sh -c 'grep -q "in pass [2-9]" "$1"' - err

stopped() { # by a signal: as it is said, and in that way it goes on
    broken_off TERM 2300000 0 && [ $status -eq 75 ] || { echo "status $status"; cat e; return 1; }
    grep -q 'stopped by .* in pass [2-9]' e || { cat e; return 1; }
    command=$(sed -n 's/.*; to go on: //p' e)
    eval "$command" >o 2>e || { cat e; return 1; }
    finished
}
check "stopped by a signal" stopped

cut_tail() { # BYTES KEPT
    rm -f a.*; cp "$2" a.journal; truncate -s -"$1" a.journal
    run 0 farm_n 0 "$SCENE" $SIZE output.image=a.pfm &&
        echo "$err" | grep -q 'bytes of the journal are damaged' && finished
}
check "a cut tail" cut_tail 100 later
flipped() { # in the middle of the first pass: all passes behind it are worth nothing
    rm -f a.*; cp later a.journal; printf '\377\0\1' | dd of=a.journal bs=1 seek=600000 conv=notrunc 2>/dev/null
    run 0 farm_n 2 "$SCENE" $SIZE output.image=a.pfm && echo "$err" | grep -q damaged &&
        grep -q 'in pass 1:' "$T/err" && finished
}
check "damage in the middle" flipped
other() { # plans follow from the target: another one is another picture
    rm -f a.*; cp later a.journal
    run 0 farm_n 0 "$SCENE" $SIZE sampling.target_error=0.02 output.image=a.pfm &&
        echo "$err" | grep -q 'is now called a.journal.1' && ! cmp -s whole.pfm a.pfm
}
check "another target" other
all_saved() { # a run whose picture cannot be written, then one that has nothing to render
    rm -f a.*; cp later a.journal
    run 1 farm_n 0 "$SCENE" $SIZE output.image=a.pfm output.report=/dev/full || return 1
    rm a.pfm
    run 0 farm_n 3 "$SCENE" $SIZE output.image=a.pfm && finished && grep -q '"primary": 0,' a.json
}
check "nothing left to render" all_saved
finish
