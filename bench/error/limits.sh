# Runs under a time limit, beside uniform sampling.

. "$HERE/error/lattice.sh"

limits() {
    begin_csv limits "$LIMITS_SIZE $(nproc)" "scene,limit,total_s,sampled_share,adaptive_samples,adaptive_s,adaptive_estimated,uniform_samples,uniform_s,slope,uniform_rmse,uniform_deviation,adaptive_rmse,adaptive_deviation,reference_rmse,guessed_rmse"
    set_size "$LIMITS_SIZE"
    too_short=
    for scene in $SCENES; do
        for limit in $LIMITS; do
            known "$scene,$limit" && continue
            one_limit "$scene" "$limit"
        done
    done
    {
        echo "# Time limits, $W x $H, -n $(nproc)"
        echo
        echo "total: from the start of the run to the end of writing a PNG. What follows is of another run, to a PFM. Sampled: of the pixels. CPU seconds are those of rendering, serving and plans, all ranks together. Beside each run stands uniform sampling with the power of two of samples, from 4 to 1024, whose CPU time comes next to its own, carried to the same CPU time along the slope that its run tells. Who has only so much time does not know that number beforehand. RMSEs are estimated of the pixels that have samples, and, where others are guessed, about that of all pixels; true ones are of some $LATTICE of all pixels, evenly spread, against 64 times the samples of the uniform picture; +- tells by how much another choice of pixels would differ."
        echo
        echo "| scene | limit, s | total, s | over by | sampled | samples | CPU s | RMSE estimated | of all | true | uniform samples | CPU s | true RMSE | in the same time | error ratio |"
        echo "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
        awk -F, 'NR > 1 { even = $11 * ($6 / $9) ^ $10
            all = $4 < 1 && $16 == "null" ? "-" : sprintf("%.3g", sqrt($4 * $7 ^ 2 + (1 - $4) * $16 ^ 2))
            printf "| %s | %s | %.2f | %+.1f %% | %.0f %% | %.1f | %.2f | %.3g | %s | %.3g +- %.2g | %s | %.2f | %.3g +- %.2g | %.3g | %.2f |\n",
            $1, $2, $3, 100 * ($3 / $2 - 1), int(100 * $4), $5, $6, $7, all, $13, $14, $8, $9, $11, $12, even, even / $13 }' "$csv"
        [ -z "$too_short" ] || printf '\nToo short for a sample on this machine: %s.\n' "${too_short#, }"
    } >"$OUT/error_limits.md"
    plot_limits
}

one_limit() { # SCENE LIMIT
    u=$WORK/even.json a=$WORK/run.json
    if ! (farm_wide run "$1" sampling.time_limit="$2" output.image="$WORK/run.png"); then
        grep -q "before any sample" "$WORK/run.log" || exit 1
        too_short="$too_short, $1 $2 s"
        return
    fi
    total=$(of "$a" time total_s)
    farm_wide run "$1" sampling.time_limit="$2"
    n=4
    farm_wide even "$1" sampling.samples=$n
    while awk "BEGIN { exit !($n < 1024 && $(cpu_of "$u") * sqrt(2) < $(cpu_of "$a")) }"; do
        n=$((2 * n))
        farm_wide even "$1" sampling.samples=$n
    done
    errors=$(lattice_errors "$1" $n) || exit 1
    put_row "$1,$2,$total,$(value "$a" sampled_share),$(value "$a" samples_per_pixel),$(cpu_of "$a"),$(value "$a" estimated_rmse),$n,$(cpu_of "$u"),$(of "$u" forecast slope),$errors,$(of "$a" sampling guessed_rmse)" 16
}

plot_limits() {
    plot <<END
$LOGLOG
set output "$OUT/error_limits.svg"
set xlabel "seconds that the run took"
set ylabel "RMSE"
set format y "%g"
set key outside below
set title "Time limits, $W x $H, -n $(nproc); dashed: uniform, in the same CPU time"
plot for [i=1:words("$SCENES")] sprintf("< grep '^%s,' $csv", word("$SCENES", i)) using 3:13 \
         with linespoints lc i pt 7 title word("$SCENES", i), \
     for [i=1:words("$SCENES")] sprintf("< grep '^%s,' $csv", word("$SCENES", i)) using 3:(\$11 * (\$6 / \$9) ** \$10) \
         with linespoints lc i pt 6 dt 2 notitle
END
}
