# The kernel's levels of processor: all give the same picture, the report names the level, and a level that the
# processor does not support is refused.
. test/lib.sh
cd "$T" || exit 1

names_what_there_is() { # REFUSED
    for other in portable avx2 avx512; do
        "$FARM" --check "$DATA/everything.ini" farm.kernel=$other >/dev/null 2>&1; there=$?
        echo "${err#*expected}" | grep -qw $other; named=$?
        [ $((there != 0)) -eq $((named != 0)) ] || return 1
    done
}

level() { # LEVEL: renders with it if this processor has it
    if ! "$FARM" --check "$DATA/everything.ini" farm.kernel="$1" >/dev/null 2>"$T/err"; then
        err=$(cat "$T/err")
        [ "$1" != portable ] && [ "$(lines "$err")" -eq 1 ] &&
            echo "$err" | grep -q "^farm.kernel=$1: kernel = $1 is not for this processor, expected auto" &&
            names_what_there_is "$1"
        return
    fi
    for formulas in exact paper; do
        run 0 farm_n 0 "$DATA/everything.ini" image.width=96 image.height=72 farm.kernel="$1" \
            render.formulas=$formulas output.image="$1-$formulas.pfm" output.report=kernel.json &&
            grep -q "^    \"kernel\": \"$1\"" kernel.json &&
            cmp "portable-$formulas.pfm" "$1-$formulas.pfm" || return 1
    done
}
for level in portable avx2 avx512; do
    check "kernel = $level gives the portable picture, or is refused" level $level
done
touching() {
    for level in portable avx2 avx512; do
        "$FARM" --check "$DATA/touching.ini" farm.kernel=$level >/dev/null 2>&1 || continue
        run 0 farm_n 0 "$DATA/touching.ini" farm.kernel=$level output.image=$level.pfm output.report=kernel.json &&
            cmp portable.pfm $level.pfm && grep -q '"unmatched_media": 0,' kernel.json || return 1
    done
}
check "glass filled to the wall" touching
rooms() {
    for level in portable avx2 avx512; do
        "$FARM" --check "$DATA/corners.ini" farm.kernel=$level >/dev/null 2>&1 || continue
        run 0 farm_n 0 "$DATA/corners.ini" farm.kernel=$level output.image=$level.pfm output.report=kernel.json &&
            cmp portable.pfm $level.pfm || return 1
    done
    run 0 farm_n 0 "$DATA/corners.ini" camera.eye="1e-9 2e-9 3e-9" output.image=aside.pfm output.report=kernel.json &&
        run 0 farm_n 0 "$DATA/corners.ini" sampling.reference=aside.pfm output.image=room.pfm \
            output.report=kernel.json &&
        awk '/"rmse"/ && !rmse { rmse = $2 + 0 } END { exit !(rmse > 0 && rmse < 0.002) }' kernel.json
}
check "a room from its very middle looks as from beside it" rooms
chosen() {
    run 0 farm_n 0 "$DATA/everything.ini" image.width=96 image.height=72 \
        output.image=auto.pfm output.report=auto.json && cmp portable-exact.pfm auto.pfm &&
        grep -qE '"kernel": "(portable|avx2|avx512)"' auto.json
}
check "a level is chosen" chosen
unknown() { run 2 farm_n 0 "$DATA/everything.ini" farm.kernel=sse9 && echo "$err" | grep -q avx512; }
check "an unknown one is refused" unknown
finish
