# The bench of the kernel with small scenes, and only the farm's part of it: the other programs are not needed.
. test/lib.sh
KERNEL=$(realpath "${KERNEL:-build/bench/kernel}")

scenes_of() { cut -d, -f1 "$1" | tail -n +2 | sort -u | tr '\n' ' '; }

farm_side() {
    run 0 timeout 120 "$KERNEL" --farm "$FARM" --programs farm --repeat 1 --scale 0.01 --size 64x48 \
        --folder "$T/bench" --csv "$T/k.csv" --markdown "$T/k.md" --montage "$T/k.png" \
        --scenes balls,tetra,mount,rings_mesh,rings,tree,lattice,million || return 1
    [ "$(scenes_of "$T/k.csv")" = "balls lattice million mount rings rings_mesh tetra tree " ] &&
        [ -s "$T/k.md" ] && [ -s "$T/k.png" ]
}
check "the farm renders every generated scene, in every step" farm_side

# column NAME STEP: the value of a column in the first row of the table with this step.
column() {
    awk -F, -v name="$1" -v step="$2" 'NR == 1 { for (i = 1; i <= NF; i++) at[$i] = i }
        $at["step"] == step { print $at[name]; exit }' "$T/k.csv"
}
rays_by_step() {
    [ "$(column primary picture)" = 3072 ] && [ "$(column primary primary)" = 3072 ] &&
        [ "$(column shadow picture)" -gt 0 ] && [ "$(column shadow shadowless)" = 0 ] &&
        [ "$(column reflection direct)" = 0 ] && [ "$(column reflection picture)" -gt 0 ]
}
check "each step traces its own kinds of ray" rays_by_step

same_scenes() {
    mkdir -p "$T/again" && run 0 "$KERNEL" --farm "$FARM" --programs farm --repeat 1 --scale 0.01 \
        --size 16x16 --steps no --folder "$T/again" --scenes balls,mount,tree || return 1
    for file in balls.ini mount.ini mount.obj tree.ini; do
        cmp "$T/bench/$file" "$T/again/$file" || return 1
    done
}
check "the scenes are the same bytes on every run" same_scenes

missing_peer() {
    run 1 "$KERNEL" --farm "$FARM" --embree "$T/none" --programs farm,embree --scenes tetra \
        --folder "$T/bench" && [ "$(lines "$err")" -eq 1 ]
}
check "a program that is not there is one line and status 1" missing_peer
finish
