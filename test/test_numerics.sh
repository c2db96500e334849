# Honest failure: samples that are not finite are counted and reported and, on request, make the run fail. Meaningless
# input is refused with its file and line before anything is rendered.
. test/lib.sh
cd "$T" || exit 1

# Two lights whose sum overflows, on a ball in the middle of the picture.
cat >bright.ini <<'END'
[image]
width = 32
height = 24
[camera]
eye = 0 0 5
look_at = 0 0 0
[light a]
position = 0 0 9
color = 1.7e308 1 1
[light b]
position = 0 0 9
color = 1.7e308 1 1
[sphere ball]
center = 0 0 0
radius = 1
END
sed '/light b/,+2d' bright.ini | sed 's/1.7e308/1/' >good.ini

one_line() { [ "$(printf '%s\n' "$err" | grep -c 'not finite')" -eq 1 ]; }

lenient() { # N
    rm -f bright.png bright.json
    run 0 farm_n "$1" bright.ini && one_line && echo "$err" | grep -q '^farm: warning: .*pixel' &&
        [ -s bright.png ] && grep -q '"first": {"rank": [0-9]*, "pixel": \[' bright.json
}
strict() { # N
    rm -f bright.png bright.json
    run 1 farm_n "$1" bright.ini render.strict=yes && one_line &&
        echo "$err" | grep -q 'render.strict' && [ -s bright.png ] && [ -s bright.json ]
}
for n in 0 1 3; do
    check "bad samples are told, -n $n" lenient $n
    check "strict ends with status 1 and a picture, -n $n" strict $n
done
clean() {
    run 0 farm_n 2 good.ini render.strict=yes && ! one_line &&
        grep -q '"nonfinite": 0,' good.json && grep -q '"first": null' good.json
}
check "strict does not mind a good picture" clean
same_first() {
    farm_n 0 bright.ini >/dev/null 2>&1; cut=$(grep '"first"' bright.json | sed 's/"rank": [0-9]*//')
    farm_n 3 bright.ini farm.tile=5 >/dev/null 2>&1
    [ -n "$cut" ] && [ "$cut" = "$(grep '"first"' bright.json | sed 's/"rank": [0-9]*//')" ]
}
check "the first one is the same on any number of processes" same_first
formulas() {
    run 0 farm_n 0 good.ini render.formulas=paper output.image=paper.pfm &&
        run 0 farm_n 0 good.ini render.formulas=exact output.image=exact.pfm &&
        run 0 "$FARM" --print-config good.ini render.formulas=paper render.strict=yes &&
        echo "$out" | grep -q '^formulas = paper$' && echo "$out" | grep -q '^strict = yes$' &&
        run 2 farm_n 0 good.ini render.formulas=both && echo "$err" | grep -q 'exact or paper'
}
check "both kinds of formulas" formulas

# refused NAME FILE LINE TEXT: the file with this text is refused at this line.
refused() {
    printf '%b' "$3" >"$1"
    run 2 "$FARM" --check "$1" || return 1
    echo "$err"
    [ "$(lines "$err")" -eq 1 ] && echo "$err" | grep -q "^$1:$2: "
}
ini() { check "refused: $1" refused bad.ini "$2" "$3"; }
ini "sphere of radius 0" 3 '[sphere a]\ncenter = 0 0 0\nradius = 0\n'
ini "radius below all numbers" 3 '[sphere a]\ncenter = 0 0 0\nradius = 1e-400\n'
ini "radius beyond all numbers" 3 '[sphere a]\ncenter = 0 0 0\nradius = 1e400\n'
ini "plane without a normal" '[0-9]*' '[plane a]\npoint = 0 0 0\nnormal = 0 0 0\n'
ini "disc without a normal" '[0-9]*' '[disc a]\ncenter = 0 0 0\nnormal = 0 0 0\nradius = 1\n'
ini "disc of radius 0" 4 '[disc a]\ncenter = 0 0 0\nnormal = 0 1 0\nradius = 0\n'
ini "cylinder of radius 0" 4 '[cylinder a]\nbase = 0 0 0\napex = 0 1 0\nradius = 0\n'
ini "cylinder without length" '[0-9]*' '[cylinder a]\nbase = 0 1 0\napex = 0 1 0\nradius = 1\n'
ini "cone of no radius" '[0-9]*' '[cone a]\nbase = 0 0 0\napex = 0 1 0\nbase_radius = 0\n'
ini "cone of negative radius" 4 '[cone a]\nbase = 0 0 0\napex = 0 1 0\nbase_radius = -1\n'
ini "box turned inside out" '[0-9]*' '[box a]\nmin = 1 0 0\nmax = 0 1 1\n'
ini "infinite shininess" 2 '[material a]\nshininess = inf\n'
ini "overflowing shininess" 2 '[material a]\nshininess = 1e309\n'
ini "shininess beyond what a logarithm tells" 2 '[material a]\nshininess = 1.1e15\n'
ini "index of refraction 0" 2 '[material a]\nior = 0\n'
ini "negative transmission" 2 '[material a]\ntransmission = -0.1\n'
ini "reflection above 1" 2 '[material a]\nreflection = 1.1\n'
ini "negative colour" 2 '[material a]\ncolor = 0 -1 0\n'
ini "light at infinity" 2 '[light a]\nposition = 0 1e999 0\n'
ini "light of no number" 3 '[light a]\nposition = 0 1 0\ncolor = nan 1 1\n'
ini "fov below all pixels" 4 '[camera]\neye = 0 0 5\nlook_at = 0 0 0\nfov = 1e-310\n'
nff() { check "refused: NFF, $1" refused bad.nff "$2" "$3"; }
scaled() { # what is wrong there is right in the file by itself
    printf 'f 1 1 1 1 0 0 0 1\ns 0 0 0 1e10\n' >big.nff
    printf '[include a]\nfile = big.nff\nscale = 1e300\n' >bad.ini
    run 0 "$FARM" --check big.nff && run 2 "$FARM" --check bad.ini || return 1
    echo "$err"
    [ "$(lines "$err")" -eq 1 ] && echo "$err" | grep -q '^big.nff:2: the radius is out of range'
}
check "refused: overflow by an include's scale" scaled
nff "sphere of radius 0" 2 'f 1 1 1 1 0 0 0 1\ns 0 0 0 0\n'
nff "overflow" 2 'f 1 1 1 1 0 0 0 1\ns 0 0 1e999 1\n'
nff "cone without length" '[0-9]*' 'f 1 1 1 1 0 0 0 1\nc\n1 1 1 2\n1 1 1 2\n'
nff "normal of 0" 5 'f 1 1 1 1 0 0 0 1\npp 3\n0 0 0 0 0 1\n1 0 0 0 0 1\n0 1 0 0 0 0\n'
nff "transparent without an index" 1 'f 1 1 1 1 0 0 1 0\ns 0 0 0 1\n'
obj() { check "refused: OBJ, $1" refused bad.obj "$2" "$3"; }
obj "overflow" 2 'v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n'
obj "normal beyond all numbers" 4 'v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 1e999 0 0\nf 1//1 2//1 3//1\n'
finish
