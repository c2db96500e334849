# What make bench-balance says of itself, and what of its report is there when only parts were made. Nothing is measured
# but the start of real runs.
. test/lib.sh
BALANCE=$(realpath "${BALANCE:-build/bench/balance}")
# It writes to the current folder.
mkdir "$T/here" && ln -s "$CONFIG" "$T/here/config" && cd "$T/here" || exit 1
REPORT=bench/out/balance.md

help() {
    run 0 "$BALANCE" --help && [ ! -e bench ] && for section in messages costs figures static real model plan marks; do
        printf '%s\n' "$out" | grep -q "^  $section " || return 1
    done
}
check "--help names every section and writes nothing" help

refused() {
    run 2 "$BALANCE" --only messages,none && printf '%s\n' "$err" | head -1 | grep -q -- --only &&
        run 2 "$BALANCE" --rounds 0 && [ ! -e bench ]
}
check "a section that there is not and a count of 0 are refused, and nothing is written" refused

unmeasured() {
    run 0 "$BALANCE" --only marks && grep -q "not measured" "$REPORT" && ! grep -q nan "$REPORT"
}
check "what was not measured has no value in the report" unmeasured

# A farm that fails, in the midst of the section.
broken() {
    mkdir -p build/bench/balance.out && echo "## earlier" >build/bench/balance.out/static.md &&
        FARM=false MPIEXEC="$MPIEXEC" run 1 "$BALANCE" --only static && run 0 "$BALANCE" --only marks &&
        grep -q "^## earlier" "$REPORT" && ! grep -q "^## Static" "$REPORT"
}
check "a section that was ended half done leaves the earlier one in the report" broken
finish
