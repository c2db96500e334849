# Every scene in config/extreme renders without a sample that is not finite, and begins with two lines of comment.
. test/lib.sh
cd "$T" || exit 1

renders() { # SCENE
    run 0 farm_n 0 "$1" render.strict=yes image.width=48 image.height=36 sampling.samples=1 \
        output.image=t.pfm output.report=t.json &&
        grep -q '"nonfinite": 0,' t.json && [ "$(wc -c <t.pfm)" -gt 20736 ]
}

explained() { # SCENE
    [ "$(sed -n '1,2{/^# ..*/p;}' "$1" | wc -l)" -eq 2 ] && sed -n 3p "$1" | grep -q '^\['
}

for scene in "$CONFIG"/extreme/*.ini; do
    which=$(basename "$scene" .ini)
    check "extreme/$which is finite throughout" renders "$scene"
    check "extreme/$which says what it shows" explained "$scene"
done

# Where the paper's formulas fail, they give another picture.
differs() {
    for formulas in exact paper; do
        run 0 farm_n 0 "$CONFIG/extreme/distant.ini" render.formulas=$formulas image.width=48 \
            image.height=36 sampling.samples=1 output.image=$formulas.pfm output.report= || return 1
    done
    ! cmp -s exact.pfm paper.pfm
}
check "extreme/distant: the paper's formulas give another picture" differs

# Where objects touch, no ray leaves glass that it has not entered, reflected rays included.
matched() {
    run 0 farm_n 0 "$CONFIG/extreme/contact.ini" image.width=96 image.height=72 sampling.samples=4 \
        output.image=t.pfm output.report=t.json && grep -q '"unmatched_media": 0,' t.json
}
check "extreme/contact: glass on a floor is left where it was entered" matched
finish
