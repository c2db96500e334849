# The sample scenes: small pictures of each have the same bits on one and on three processes.
. test/lib.sh
cd "$T" || exit 1

sample() { # NAME LEAST: triangles it has at least
    run 0 farm_n 0 "$CONFIG/$1.ini" image.width=64 image.height=48 sampling.samples=1 \
        output.image=a.pfm output.report=a.json || return 1
    run 0 farm_n 3 "$CONFIG/$1.ini" image.width=64 image.height=48 sampling.samples=1 \
        output.image=b.pfm output.report= || return 1
    grep '"nonfinite"' a.json
    triangles=$(sed -n 's/.*"triangles": *\([0-9]*\).*/\1/p' a.json)
    echo "$triangles triangles"
    cmp a.pfm b.pfm && grep -q '"nonfinite": *0' a.json && [ "$triangles" -ge "$2" ]
}
check "hello" sample hello 0
check "lantern, 50,000 triangles or more" sample lantern 50000
check "garden, 300,000 triangles or more" sample garden 300000

default_names() {
    run 0 farm_n 2 "$CONFIG/hello.ini" image.width=16 image.height=12 && [ -s hello.png ] &&
        [ -s hello.json ]
}
check "picture and report are named after the scene, in the current folder" default_names
finish
