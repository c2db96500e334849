#!/bin/sh
# Measures what the exact formulas cost: renders pictures with them and with the paper's in turn, so that other load of
# the machine affects both. The result is the median of the pairs' ratios.
#
#   FARM=./farm sh bench/stability_cost.sh [PAIRS [SECTION.KEY=VALUE...]]
#
# One process renders, and the CPU time of its rendering thread is taken from the report. Status 1 if a scene takes more
# than 10 % longer.
set -eu
export LC_ALL=C # figures with a decimal point
cd "$(dirname "$0")/.."
. bench/report.sh
FARM=$(realpath "${FARM:-./farm}")
pairs=${1:-7}
[ $# -eq 0 ] || shift
status=0
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM

# cpu_seconds SCENE FORMULAS [OVERRIDE...]
cpu_seconds() {
    scene_file=config/$1.ini formulas=$2
    shift 2
    "$FARM" "$scene_file" "render.formulas=$formulas" "output.image=$T/picture.png" \
        "output.report=$T/report.json" "$@" >"$T/log" 2>&1 || { cat "$T/log" >&2; exit 1; }
    value "$T/report.json" cpu_s head
}

for scene in garden lantern; do
    : >"$T/ratios"
    for i in $(seq "$pairs"); do
        # The order within a pair alternates.
        if [ $((i % 2)) -eq 0 ]; then
            exact=$(cpu_seconds "$scene" exact "$@") paper=$(cpu_seconds "$scene" paper "$@")
        else
            paper=$(cpu_seconds "$scene" paper "$@") exact=$(cpu_seconds "$scene" exact "$@")
        fi
        echo "$exact $paper" | awk '{ print $1 / $2, $1, $2 }' >>"$T/ratios"
    done
    sort -n "$T/ratios" | awk -v scene="$scene" '{ r[NR] = $1; e[NR] = $2; p[NR] = $3 }
        END {
            m = int((NR + 1) / 2)
            printf "cost, %s: exact / paper = %.3f (median of %d pairs, %.3f to %.3f; ", scene,
                r[m], NR, r[1], r[NR]
            printf "%.2f s against %.2f s): %s\n", e[m], p[m], r[m] <= 1.1 ? "green" : "RED"
            exit r[m] > 1.1
        }' || status=1
done
exit $status
