# How a run ends if something outside of it fails: with a clear message, without hanging, and without incomplete files.
. test/lib.sh
cd "$T" || exit 1
SCENE=$DATA/everything.ini
SLOW="image.width=1500 image.height=1500 sampling.samples=16"

# Signs that a run is at work: a journal with more than a header, a preview, a message.
kept() { [ "$(stat -c %s everything.journal 2>/dev/null || echo 0)" -gt 24 ]; }
shown() { [ -s everything.png ] && rm everything.png; }
waits() { grep -q 'waiting for somebody who reads' e; }

# stopped SIGN SIGNAL OVERRIDE...: a run on $n processes that is sent the signal at this sign. Sets status, and writes
# the messages to the file e. Background jobs of a script ignore SIGINT, and so does setsid's child; so the program is
# started by env, which restores the default.
stopped() {
    at_work=$1 signal_sent=$2; shift 2
    farm_bg() {
        if [ "$n" -eq 0 ]; then exec env --default-signal=INT "$FARM" "$SCENE" $SLOW "$@"
        else exec env --default-signal=INT "$MPIEXEC" -n "$n" "$FARM" "$SCENE" $SLOW "$@"; fi
    }
    farm_bg "$@" >o 2>e &
    pid=$!
    i=0
    until $at_work || [ $i -ge 600 ]; do sleep 0.05; i=$((i + 1)); done
    kill -"$signal_sent" $pid
    i=0
    while kill -0 $pid 2>/dev/null && [ $i -lt 200 ]; do sleep 0.05; i=$((i + 1)); done
    if [ $i -ge 200 ]; then kill -9 $pid; echo "still running after 10 s"; cat e; return 1; fi
    wait $pid
    status=$?
    cat e
    echo "status $status"
}

no_table() {
    farm_n "$n" "$SCENE" output.image=full.png output.report= >/dev/full 2>e
    status=$?
    cat e
    # With mpiexec, it is mpiexec that writes to the full disk.
    [ -s full.png ] && { [ "$n" -gt 0 ] || { [ $status -eq 1 ] && grep -q 'standard output' e; }; }
}

for n in 0 3; do
    full() { # KEY: told, and what goes on from there without rendering again
        farm_n "$n" "$SCENE" output.image=full.png "$1=/dev/full" >o 2>e
        status=$?
        cat e
        [ $status -ne 0 ] && [ "$(wc -l <e)" -eq 2 ] && grep -q 'No space left' e || return 1
        [ "$n" -gt 0 ] || [ $status -eq 1 ] || return 1 # nobody has asked it to stop
        grep -q '; to write the report, too, .*: .*farm' e && [ -s full.png ] || return 1
        grep -q 'Wall time of rank 0' o && ! grep -q '^report' o || { cat o; return 1; }
        run 0 farm_n "$n" "$SCENE" output.image=full.png && cat "$T/err" &&
            grep -q 'going on with full.journal' "$T/err" &&
            grep -q '"primary": 0,' full.json && [ ! -e full.journal ]
    }
    check "no space for the report, -n $n" full output.report
    full_late() { # nothing is kept: what goes on would render on, and get another picture
        rm -f full.png
        farm_n "$n" "$SCENE" image.width=300 image.height=300 output.image=full.png output.report=/dev/full \
            sampling.time_limit=$((n > 0 ? 3 : 1)) >o 2>e
        status=$?
        cat e
        [ $status -ne 0 ] && { [ "$n" -gt 0 ] || [ $status -eq 1 ]; } && grep -q 'No space left' e &&
            ! grep -q 'to write the report\|without rendering' e && [ -s full.png ] && [ ! -e full.journal ]
    }
    check "no space for the report of a time limit, -n $n" full_late
    no_trace() { # which the rendering alone can tell: what goes on would write an empty one
        farm_n "$n" "$SCENE" output.image=full.png output.trace=/dev/full \
            output.heatmap=heat.png >o 2>e
        status=$?
        cat e o
        [ $status -ne 0 ] && [ "$(wc -l <e)" -eq 1 ] && grep -q 'output.trace=FILE' e &&
            grep -q '^report  full.json' o && rm full.png full.json heat.png && [ ! -e full.journal ]
    }
    check "no space for the trace, -n $n" no_trace
    check "no space for the table, -n $n" no_table

    head_run() {
        { { farm_n "$n" "$SCENE" output.image="h$n.png"; echo $? >status; } | head -n 1 >first; } 2>err
        cat err first
        [ -s first ] && [ -s "h$n.png" ] && [ -s status ] && [ "$(wc -l <err)" -le 1 ]
    }
    check "piped into head, -n $n" head_run

    for signal in INT TERM USR1; do
        interrupted() {
            echo >old.json
            stopped kept $signal output.report=old.json && [ $status -eq 75 ] && [ -s everything.png ] &&
                [ -s everything.journal ] && grep -q "stopped by .*SIG$signal.* of the pixels" e &&
                    grep -q "to go on: .*farm.* '\{0,1\}$SCENE" e &&
                grep -q '^farm: old.json is of an earlier run' e || return 1
            rm old.json everything.png everything.journal
        }
        check "SIG$signal, -n $n" interrupted
    done
done

# While MPI starts it has a handler of SIGUSR1 of its own, which a run without mpiexec does not come back from.
early() {
    pids= i=0
    while [ $i -lt 20 ]; do
        "$FARM" "$SCENE" $SLOW output.image=early.png output.journal= >o 2>e &
        pid=$!
        sleep 0.0$((10 + 4 * i))
        kill -USR1 $pid
        j=0
        while kill -0 $pid 2>/dev/null && [ $j -lt 500 ]; do sleep 0.02; j=$((j + 1)); done
        if [ $j -ge 500 ]; then kill -9 $pid; echo "still running after 10 s"; cat e; return 1; fi
        wait $pid
        status=$?
        case $status in 1 | 75 | 138) ;; *) echo "status $status"; cat e; return 1 ;; esac
        i=$((i + 1))
    done
    rm -f early.png
}
check "SIGUSR1 while MPI starts" early

closed() { # the picture is written, what has no place is told, and none of it goes to MPI
    rm -f c.png
    run 1 sh -c "timeout 60 '$FARM' '$SCENE' output.image=c.png <&- >&-" && cat "$T/err" && [ -s c.png ] &&
        grep -q '^farm: cannot write to standard output: Bad file descriptor; the picture is in c.png$' "$T/err" &&
        rm c.png || return 1
    run 2 sh -c "timeout 60 '$FARM' '$SCENE' output.image=c.png output.report=/dev/stdout <&- >&-" &&
        cat "$T/err" && grep -q '^/dev/stdout: cannot write: Bad file descriptor' "$T/err" && [ ! -e c.png ] || return 1
    run 0 sh -c "timeout 60 '$FARM' '$SCENE' output.image=c.png <&- 2>&-" && grep -q 'Wall time of rank 0' "$T/out" &&
        rm c.*
}
check "started without standard input, output or errors" closed

unkept() {
    stopped shown TERM output.journal= output.preview=0.5 && [ $status -eq 1 ] && [ -s everything.png ] &&
        [ ! -e everything.journal ] && grep -q 'nothing is kept' e && ! grep -q 'earlier run' e && rm everything.png
}
for n in 0 1 2; do check "stopped without a journal, -n $n" unkept; done

nowhere() { # ARGUMENT...: what is asked for instead of a picture
    "$FARM" "$@" >/dev/full 2>e
    status=$?
    cat e
    [ $status -eq 1 ] && grep -q 'cannot write to standard output: No space left' e
}
check "no space for --help" nowhere --help
check "no space for --print-config" nowhere --print-config "$SCENE"

rows_later() { # who reads them leaves
    mkfifo rows.csv
    head -c 10 rows.csv >/dev/null &
    run 1 farm_n 0 "$SCENE" sampling.samples=16 output.image=later.png output.error=rows.csv && cat "$T/err" &&
        grep -q '^farm: output.error could not be written' "$T/err" && [ -s later.png ] && rm rows.csv later.*
}
check "rows of error that nobody reads any more" rows_later

no_rows() { # found out at once, although the picture would take minutes
    run 1 timeout 20 "$FARM" "$SCENE" $SLOW output.image=r.png output.error=/dev/full || return 1
    cat "$T/err"
    [ "$(lines "$err")" -eq 1 ] && [ ! -e r.png ] && [ ! -e r.journal ] &&
        echo "$err" | grep -q 'output.error = /dev/full cannot be written: No space left on device'
}
check "no space for the rows of error" no_rows

whole() { # no preview of it
    settings="image.width=200 image.height=200 sampling.samples=8 output.image=whole.png output.report="
    mkfifo whole.png
    timeout 60 cat whole.png >copy.png &
    run 0 farm_n 2 "$SCENE" $settings output.preview=0.1 || return 1
    wait && rm whole.png && run 0 farm_n 2 "$SCENE" $settings && cmp copy.png whole.png
}
check "a picture into a pipe comes whole" whole

no_reader() { # of a pipe: what is rendered is kept
    mkfifo pipe.png
    (SLOW= && stopped waits TERM output.image=pipe.png output.report= && [ $status -eq 75 ]) || return 1
    grep -q 'waiting for somebody who reads' e && grep -q 'without rendering it again: ' e &&
        [ -s pipe.journal ] && rm pipe.png pipe.journal
}
for n in 0 2; do check "a picture into a pipe that nobody reads from, -n $n" no_reader; done

# A second signal of any kind ends the run at once, before the large picture is written.
twice() { # STATUS FIRST SECOND
    rm -f w.*
    set -- "$@" "$FARM" "$SCENE" image.width=4000 image.height=4000 sampling.samples=2 output.image=w.png
    want=$1 first=$2 second=$3; shift 3
    [ "$n" -eq 0 ] || set -- "$MPIEXEC" -n "$n" "$@"
    env --default-signal=INT "$@" >o 2>e &
    pid=$!
    i=0 # a journal's head alone has 24 bytes
    while [ "$(stat -c %s w.journal 2>/dev/null || echo 0)" -le 24 ] && [ $i -lt 600 ]; do
        sleep 0.05
        i=$((i + 1))
    done
    kill -"$first" $pid; sleep 0.3; kill -"$second" $pid
    wait $pid
    status=$?
    cat e
    echo "status $status"
    [ $status -eq "$want" ] && [ ! -e w.png ] && [ "$(stat -c %s w.journal)" -gt 24 ]
}
for n in 0 1 2; do check "two signals of different kinds, -n $n" twice 143 USR1 TERM; done
n=0
check "a second Ctrl-C" twice 130 INT INT
rm -f w.*

other_launcher() { # srun, as far as a rank sees it: the command cannot tell all of it
    printf '#!/bin/sh\nexec env -u HYDI_CONTROL_FD "%s" "$@"\n' "$FARM" >launched && chmod +x launched
    (FARM=$T/launched && stopped kept TERM) &&
        grep -q "; to go on, start it in the same way: [^ ]*farm[^ ]* '\{0,1\}$SCENE" e && rm everything.*
}
n=2
check "stopped under another launcher" other_launcher

# Whether the process has ended, be it that nobody has asked for its status yet; otherwise it is killed.
ended() {
    i=0
    while grep -q '^State:.[^Z]' "/proc/$1/status" 2>/dev/null; do
        [ $i -lt 150 ] || { kill -9 "$1"; return 1; }
        sleep 0.1
        i=$((i + 1))
    done
}
alone() { # neither rank 0 nor what would end the job in its place is left
    "$MPIEXEC" -n 2 "$FARM" "$SCENE" $SLOW farm.patience=1 output.image=alone.png >o 2>e &
    pid=$!
    until [ -s alone.journal ]; do sleep 0.1; kill -0 $pid || { cat e; return 1; }; done
    proxy=$(pgrep -P $pid) && ranks=$(pgrep -P "$proxy") || return 1
    for rank in $ranks; do tr '\0' '\n' <"/proc/$rank/environ" | grep -qx 'PMI_RANK=[^0].*' && other=$rank; done
    kill -9 "$proxy" $(echo "$ranks" | grep -vx "$other")
    ended "$other"
    left=$?
    wait $pid
    return $left
}
check "a rank that is left alone ends" alone
rm -f alone.*

unwritable() { # found out before rendering: at once, although the picture would take minutes
    run 2 "$FARM" "$SCENE" $SLOW output.image=/proc/none/a.png && echo "$err" | grep -q output.image
}
check "unwritable output is found before rendering" unwritable
keeps() {
    echo old >old.png
    run 2 "$FARM" "$SCENE" output.image=old.png output.report=/proc/none/a.json
    [ "$(cat old.png)" = old ]
}
check "what stood there is not touched by a run that cannot start" keeps
finish
