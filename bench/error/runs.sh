# Runs of the farm.

# farm NAME SCENE OVERRIDE...: renders to $WORK/NAME.pfm and .json
farm() {
    name=$1 config=$(config_of "$2"); shift 2
    "$FARM" "$config" image.width=$W image.height=$H output.image="$WORK/$name.pfm" \
        output.report="$WORK/$name.json" output.journal= "$@" >"$WORK/$name.log" 2>&1 ||
        { cat "$WORK/$name.log" >&2; exit 1; }
}

# Calls farm() REPEAT times; sets cpu to the median of its CPU seconds.
farm_repeated() {
    farm "$@"
    farm_repeated_on "$@"
}
# The same for runs that take at most SHORT CPU seconds; longer ones are made once.
SHORT=2
farm_if_short_repeated() {
    farm "$@"
    cpu=$(cpu_of "$WORK/$1.json")
    awk "BEGIN { exit !($cpu < $SHORT) }" || return 0
    farm_repeated_on "$@"
}
# What is left of the repetitions after the first run.
farm_repeated_on() {
    times=$(cpu_of "$WORK/$1.json")
    for _ in $(seq 2 "$REPEAT"); do
        farm "$@"
        times="$times $(cpu_of "$WORK/$1.json")"
    done
    cpu=$(median_of $times)
}

# farm() on all cores; the CPU time is the sum over them.
farm_wide() { FARM_ALONE=$FARM FARM="on_all_cores"; farm "$@"; FARM=$FARM_ALONE; }
on_all_cores() { "$MPIEXEC" -n "$(nproc)" "$FARM_ALONE" "$@"; }

# keep NAME PATH: moves the results of farm() to PATH.pfm and PATH.json, which are complete or do not exist. (A farm
# that is stopped writes the picture so far.)
keep() { mv "$WORK/$1.json" "$2.json" && mv "$WORK/$1.pfm" "$2.pfm" || exit 1; }

reference_at() { echo "$KEPT/ref_${W}x${H}x${MANY}_$1"; }
# Rendered on all cores, as its time is not measured.
reference_of() {
    reference=$(reference_at "$1")
    [ -e "$reference.pfm" ] && return
    farm_wide whole "$1" image.width=$((W + 2000)) "image.region=1000 0 $W $H" sampling.samples=$MANY
    keep whole "$reference"
}
