# Depth and cutoff: error and claimed bound.

# One sample in the middle of each pixel, so that the pictures differ by truncation alone.
truncation() {
    begin_csv truncation "$SIZE $REPEAT" "scene,knob,setting,cpu_s,rmse,max,claimed,held"
    for scene in $SCENES; do
        deep=$KEPT/deep_${W}x${H}_$scene
        [ -e "$deep.pfm" ] || {
            farm whole "$scene" sampling.samples=1 render.max_depth=40 render.cutoff=1e-7
            keep whole "$deep"
        }
        for depth in 0 1 2 3 4 6 8 12 16 20; do
            one_truncation "$scene" depth $depth render.max_depth=$depth render.cutoff=1e-7
        done
        for power in 4 6 8 9 10 12 14 16; do
            cutoff=$(awk "BEGIN { printf \"%.17g\", 2 ^ -$power }")
            one_truncation "$scene" cutoff 1/$((1 << power)) render.max_depth=40 render.cutoff="$cutoff"
        done
    done
    {
        echo "# Truncation: depth and cutoff, against depth 40 and a cutoff of 1e-7"
        echo
        echo "A bound holds where the largest error is within it and what the picture beside which that is claims to lack itself."
        echo
        echo "| scene | knob | setting | CPU s | RMSE | largest error | claimed bound | holds |"
        echo "|---|---|---|---|---|---|---|---|"
        awk -F, 'NR > 1 { printf "| %s | %s | %s | %.3f | %.3g | %.3g | %s | %s |\n", $1, $2, $3, $4, $5, $6, $7 == "null" ? "none" : sprintf("%.3g", $7), $8 }' "$csv"
    } >"$OUT/error_truncation.md"
    for scene in $SCENES; do plot_truncation "$scene"; done
    broken=$(awk -F, '$8 == "NO" { n++ } END { print n + 0 }' "$csv")
}

one_truncation() {
    scene=$1 knob=$2 setting=$3; shift 3
    known "$scene,$knob,$setting" && return
    farm_repeated run "$scene" sampling.samples=1 sampling.reference="$deep.pfm" "$@"
    r=$WORK/run.json
    most=$(of "$r" reference max) bound=$(of "$r" bound truncation) lacking=$(of "$deep.json" bound truncation)
    # The reference may lack something, too, for which its own bound allows; 1e-6 allows for the rounding to floats.
    held=$(awk -v m="$most" -v b="$bound" -v d="$lacking" 'BEGIN {
        print m == "" || b == "" || d == "" ? "" : b == "null" || d == "null" ? "-" : m <= b + d + 1e-6 ? "yes" : "NO" }')
    put_row "$scene,$knob,$setting,$cpu,$(of "$r" reference rmse),$most,$bound,$held" 7
}

# Rows without any error or without a bound cannot be plotted.
plot_truncation() {
    awk -F, -v s="$1" '$1 == s && $5 > 0 { some = 1 } END { exit !some }' "$csv" || return 0
    plot <<END
$LOGLOG
set output "$OUT/error_truncation_$1.svg"
set xlabel "CPU seconds"
set ylabel "error"
set format y "%g"
set key outside below
set title "$1, $W x $H: depth 0 to 20, cutoff 1/16 to 1/65536"
some(x) = x > 0 ? x : NaN
plot "< grep '^$1,depth' $csv" using 4:(some(\$5)) with linespoints lc 1 pt 7 title "depth: RMSE", \
     "" using 4:(some(\$6)) with points lc 1 pt 6 title "depth: largest", \
     "" using 4:(some(\$7)) with points lc 1 pt 1 title "depth: claimed", \
     "< grep '^$1,cutoff' $csv" using 4:(some(\$5)) with linespoints lc 2 pt 5 title "cutoff: RMSE", \
     "" using 4:(some(\$6)) with points lc 2 pt 4 title "cutoff: largest", \
     "" using 4:(some(\$7)) with points lc 2 pt 2 title "cutoff: claimed"
END
}
