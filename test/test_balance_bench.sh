# The messages of make bench-balance, and which parts its report has if only some were made. The only measurement is the
# start of real runs.
. test/lib.sh
BALANCE=$(realpath "${BALANCE:-build/bench/balance}")
# The bench writes to the current folder.
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

scene() { # what takes long, as it begins
    printf '[sphere a]\ncenter = 0 0 0\nradius = 1\n[light a]\nposition = 0 9 9\n' >ball.ini
    MESSAGES=false MPIEXEC="$MPIEXEC" run 1 "$BALANCE" --scene ball.ini --rounds 1 && echo "$err" &&
        [ "$(echo "$err" | grep -c '^measuring the costs of ball.ini, .* 1 sample: round 1 of 1$')" -eq 1 ] &&
        echo "$err" | grep -q '^measuring messages between two ranks: run 1 of '
}
check "a scene of one's own: what is measured, step by step" scene

# A farm that fails, in the midst of the section.
broken() {
    mkdir -p build/bench/balance.out && echo "## earlier" >build/bench/balance.out/static.md &&
        FARM=false MPIEXEC="$MPIEXEC" run 1 "$BALANCE" --only static && run 0 "$BALANCE" --only marks &&
        grep -q "^## earlier" "$REPORT" && ! grep -q "^## Static" "$REPORT"
}
check "a section that was ended half done leaves the earlier one in the report" broken
finish
