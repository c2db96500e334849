# Functions for the test scripts that interrupt runs and continue them; sourced instead of lib.sh. SCENE and SIZE
# (further arguments) are the picture. KEPT is the name of a journal that is kept; each attempt leaves files a.*.
. test/lib.sh
cd "$T" || exit 1
SCENE=$DATA/everything.ini

whole() { run 0 farm_n 2 "$SCENE" $SIZE output.image=whole.pfm output.report=whole.json; }
finished() { cmp whole.pfm a.pfm && [ ! -e a.journal ]; }
resume_from() { rm -f a.*; cp "$1" a.journal; } # KEPT

# broken_off SIGNAL BYTES PROCESSES ARGUMENT...: a run that is sent the signal when its journal has this size. On a busy
# machine it may be complete before that is noticed; then it is tried again.
broken_off() { broken_off_once "$@" || broken_off_once "$@" || broken_off_once "$@"; }
broken_off_once() {
    signal=$1 bytes=$2 processes=$3; shift 3
    rm -f a.*
    if [ "$processes" -eq 0 ]; then "$FARM" "$SCENE" $SIZE output.image=a.pfm "$@" >o 2>e &
    else "$MPIEXEC" -n "$processes" "$FARM" "$SCENE" $SIZE output.image=a.pfm "$@" >o 2>e & fi
    pid=$!
    i=0
    while [ "$(stat -c %s a.journal 2>/dev/null || echo 0)" -lt "$bytes" ] && [ $i -lt 1500 ]; do
        kill -0 $pid 2>/dev/null || break
        sleep 0.02; i=$((i + 1))
    done
    kill -"$signal" $pid; sent=$?
    wait $pid 2>/dev/null
    status=$?
    [ $sent -eq 0 ] || return 1
    # mpiexec's processes end when they notice that it is gone.
    i=0
    while ! flock -n a.journal true && [ $i -lt 100 ]; do sleep 0.05; i=$((i + 1)); done
    [ -s a.journal ]
}

cut_tail() { # BYTES KEPT
    resume_from "$2"; truncate -s -"$1" a.journal
    run 0 farm_n 0 "$SCENE" $SIZE output.image=a.pfm &&
        echo "$err" | grep -q 'bytes of the journal are damaged' && finished
}
damage_at() { printf '\377\0\1' | dd of=a.journal bs=1 seek="$1" conv=notrunc 2>/dev/null; } # OFFSET
resumed() { sed -n "/\"resumed\"/,/}/s/^ *\"$1\": \([0-9]*\),$/\1/p" a.json; } # FIELD
flipped() { # OFFSET PROCESSES KEPT: few bytes are of no use, and so few tiles are lost
    resume_from "$3"; damage_at "$1"
    run 0 farm_n "$2" "$SCENE" $SIZE output.image=a.pfm && cat "$T/err" &&
        bytes=$(sed -n 's/.*: \([0-9]*\) bytes of the journal are damaged, .*/\1/p' "$T/err") &&
        [ "$bytes" -gt 0 ] && [ $((4 * bytes)) -lt "$(stat -c %s "$3")" ] && finished
}
# The forecast of a smaller error must include the CPU time of the earlier run. Its wall time depends on what else the
# machine did.
forecast_has() { # PROCESSES
    saved=$(sed -n 's/.* \([0-9.]*\) s of CPU time saved$/\1/p' "$T/err")
    foreseen=$(sed -n '/"forecast"/,/}/s/^ *"render_s": \([0-9.]*\),$/\1/p' a.json)
    echo "forecast: $foreseen s, saved: $saved s, $1 renderers"
    awk "BEGIN { exit !($saved > 0 && $foreseen > $saved / $1) }"
}
all_saved() { # KEPT: a run whose picture cannot be written, then one that has nothing to render
    resume_from "$1"
    run 1 farm_n 0 "$SCENE" $SIZE output.image=a.pfm output.report=/dev/full || return 1
    rm a.pfm
    run 0 farm_n 3 "$SCENE" $SIZE output.image=a.pfm && finished && grep -q '"primary": 0,' a.json && forecast_has 3
}
damaged_once() { # OFFSET KEPT: it is told once, and what was rendered in place of it stands in the journal
    resume_from "$2"; damage_at "$1"
    run 1 farm_n 0 "$SCENE" $SIZE output.image=a.pfm output.report=/dev/full || return 1
    echo "$err" | grep -q 'bytes of the journal are damaged' && rm a.pfm &&
        run 0 farm_n 2 "$SCENE" $SIZE output.image=a.pfm && finished && cat "$T/err" &&
        ! echo "$err" | grep 'bytes of the journal' && grep -q '"primary": 0,' a.json
}
