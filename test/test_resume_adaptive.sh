# The journal with adaptive sampling: a run that was ended in any pass continues there, and gives the same picture in
# the end.
. test/resume.sh
SIZE="image.width=200 image.height=200 sampling.target_error=0.0015"
check "an uninterrupted run" whole
passes_of() { sed -n 's/^ *"passes": \([0-9]*\),$/\1/p' "$1"; }

# The first pass has 40,000 pixels of 32 bytes each.
first() { broken_off 9 560000 0 && cp a.journal first; }
check "killed in the first pass" first
later() { broken_off 9 1600000 0 && cp a.journal later; }
check "killed in a later pass" later

goes_on() { # KEPT PROCESSES ARGUMENT...
    kept=$1 n=$2; shift 2
    resume_from "$kept"
    run 0 farm_n "$n" "$SCENE" $SIZE output.image=a.pfm "$@" && cat "$T/err" &&
        grep -q 'going on with a.journal \(in\|after\) pass [1-9]' "$T/err" && finished &&
        grep -A 1 '"resumed"' a.json | grep -q '"tiles": [1-9]' &&
        [ "$(passes_of a.json)" = "$(passes_of whole.json)" ]
}
check "first: with smaller tiles" goes_on first 2 farm.tile=5
check "later: the same command goes on" goes_on later 0
check "later: on three processes, with larger tiles" goes_on later 3 farm.tile=48
check "in a later pass" sh -c 'grep -q "\(in\|after\) pass [2-9]" "$1"' - err

# With so many processes that the first row is due when rendering begins, in the middle of a pass.
rows_rise() {
    for processes in 8 16 32; do
        goes_on later $processes output.error=rows.csv && cat rows.csv || return 1
        [ "$(wc -l <rows.csv)" -lt 3 ] || break
    done
    awk -F, 'NR == 1 { next }
        NR > 2 { falls += !($1 > time && $2 >= samples) }
        { time = $1; samples = $2 } END { exit falls || NR < 3 }' rows.csv
}
check "rows of the error, one after the other" rows_rise

stopped() { # by a signal: as it is said, and in that way it goes on
    broken_off TERM 1600000 0 && [ $status -eq 75 ] || { echo "status $status"; cat e; return 1; }
    grep -q 'stopped by .* in pass [2-9]' e && grep -q 'and what is finished of pass [2-9] are saved in' e ||
        { cat e; return 1; }
    command=$(sed -n 's/.*; to go on: //p' e)
    eval "$command" >o 2>e || { cat e; return 1; }
    finished
}
check "stopped by a signal" stopped

check "a cut tail" cut_tail 100 later
# Damage in the middle of the first pass: one or two of its tiles, of 256 pixels, are lost. All later passes, which are
# planned when it is complete, cannot be used.
first_flipped() {
    flipped 420000 2 later && grep -q 'bytes of the journal cannot be used' "$T/err" &&
        grep -q 'in pass 1:' "$T/err" && [ "$(resumed pixels)" -ge $((40000 - 512)) ] &&
        [ "$(passes_of a.json)" = "$(passes_of whole.json)" ]
}
check "damage in the middle" first_flipped
later_flipped() { flipped 1500000 2 later && grep -q '\(in\|after\) pass [2-9]:' "$T/err"; }
check "damage in a later pass" later_flipped
check "damage that was there before" damaged_once 420000 later
other() { # plans follow from the target: another one is another picture
    resume_from later
    run 0 farm_n 0 "$SCENE" $SIZE sampling.target_error=0.02 output.image=a.pfm &&
        echo "$err" | grep -q 'is now called a.journal.1' && ! cmp -s whole.pfm a.pfm
}
check "another target" other
check "nothing left to render" all_saved later
check "after the last pass, as is told" grep -q "after pass $(passes_of whole.json)" err
# A disk that takes the first pass but not all of them: the journal goes elsewhere as a whole, which leaves room for the
# picture where it was.
cat >fills <<'END'
mount -t tmpfs -o size=1900k none small && cd small || exit 1
"$@" >../o 2>../e
[ $? -eq 1 ] && [ -z "$(ls)" ] || { ls -l; exit 1; }
eval "$(sed -n 's/.*; to write the picture without rendering it again: //p' ../e)" >../o && cp a.pfm ..
END
full_disk() (
    rm -f a.*
    mkdir -p elsewhere
    TMPDIR=$T/elsewhere timeout 60 unshare --mount sh fills "$FARM" "$SCENE" $SIZE output.image=a.pfm farm.tile=16
    status=$?
    cat e
    [ $status -eq 0 ] && grep -q "are saved in $T/elsewhere/a-[0-9]*.journal;" e && finished && [ -z "$(ls elsewhere)" ]
)
mkdir small
if unshare --mount mount -t tmpfs none small 2>/dev/null; then check "no room for all passes" full_disk
else count=$((count + 1)); echo "not ok $count - no room for all passes # SKIP nothing can be mounted"; fi

# How long a pass may take depends on when it begins. Passes in the journal must be planned again with the limits that
# they had then.
timed() {
    SIZE="image.width=200 image.height=200"
    broken_off 9 1600000 0 sampling.time_limit=60 &&
        run 0 farm_n 2 "$SCENE" $SIZE sampling.time_limit=4 output.image=a.pfm && cat "$T/err" &&
        grep -q 'going on with a.journal \(in\|after\) pass [2-9]' "$T/err" && ! grep 'cannot be used' "$T/err"
}
check "killed in a later pass under a time limit" timed

# The time limit is a quarter of what the first pass would take on this machine. So the first pass is cut off early, and
# the run is killed during the passes for lattices after it, so that its journal can lose the first pass. In the
# meantime the machine may become more than twice as busy, or half as busy.
SIZE="image.width=240 image.height=240"
even() { run 0 farm_n 2 "$SCENE" $SIZE sampling.samples=32 output.image=even.pfm output.report=even.json; }
check "a reference" even
limit=$(sed -n '/"time"/,/}/s/^ *"render_s": \(.*\),$/\1/p' even.json | awk '{ print $1 * 128 / 32 / 4 }')
SIZE="$SIZE sampling.min_samples=128 sampling.time_limit=$limit"
cut_off() { broken_off 9 160000 2 && cp a.journal cut; }
check "killed among lattices" cut_off
goes_on_among() { # the picture is what it is to be
    run 0 farm_n 2 "$SCENE" $SIZE output.image=a.pfm sampling.reference=even.pfm && cat "$T/err" || return 1
    rmse=$(sed -n '/"reference"/,/}/s/^ *"rmse": \(.*\),$/\1/p' a.json)
    echo "limit $limit RMSE $rmse, $(resumed pixels) pixels"
    awk "BEGIN { exit !($rmse < 0.025) }" && [ "$(resumed pixels)" -gt 100 ] &&
        grep -q 'going on with a.journal \(in\|after\) pass [2-9]' "$T/err"
}
among_lattices() { resume_from cut && goes_on_among && ! grep -q 'cannot be used' "$T/err"; }
check "goes on among lattices" among_lattices
first_lost() { # of the first pass nothing is left
    resume_from cut
    dd if=/dev/zero of=a.journal bs=1000 seek=1 count=80 conv=notrunc 2>/dev/null
    goes_on_among
}
check "goes on without what the first pass brought" first_lost
finish
