# A run predicts what its goal costs; a run with the predicted number of samples, or with the goal as its target, shows
# what it does cost. The predicted wall seconds are converted to CPU seconds by the ratio of the two in the first run.

# foretold_of REPORT KEY: the forecast's wall seconds of rendering, converted to CPU seconds. 1e9: infinite.
foretold_of() {
    awk -v s="$(of "$1" forecast "$2")" -v wall="$(of "$1" time render_s)" -v cpu="$(cpu_of "$1")" 'BEGIN {
        if (s == "" || cpu == "" || !(wall > 0)) exit 1
        print s == "null" ? 1e9 : s / wall * cpu }'
}
# The median of such seconds, as a field of a row.
foretold_median() { median_of "$@" | awk '{ print ($1 < 1e9 ? sprintf("%.3f", $1) : "inf") }'; }

forecast() {
    begin_csv forecast "$SIZE $REPEAT" "scene,method,rmse,cpu_s,later,equal_s,equal_low_s,equal_high_s,took_s,off,goal,foretold_s,low_s,high_s"
    for scene in $SCENES; do
        for setting in samples=4 samples=8 samples=16 target_error=0.02 target_error=0.012 target_error=0.007; do
            known "$scene,$setting" || forecast_row
        done
    done
    forecast_table >"$OUT/error_forecast.md"
    plot_forecast
}

# The row of $scene with $setting; none if the first run forecasts nothing.
forecast_row() {
    cpu="" took="" told="" lows="" highs="" r=$WORK/first.json
    # In turns, so that changes in the speed of the machine affect both runs alike.
    for _ in $(seq "$REPEAT"); do
        farm first "$scene" "sampling.$setting"
        grep -q '"forecast": null' "$r" && return
        goal=$(of "$r" forecast rmse) slope=$(of "$r" forecast slope)
        case $setting in
        samples=*) farm run "$scene" sampling.samples="$(of "$r" forecast samples)" ;;
        *) farm run "$scene" sampling.target_error="$goal" ;;
        esac
        cpu="$cpu $(cpu_of "$r")" took="$took $(cpu_of "$WORK/run.json")"
        s=$(foretold_of "$r" render_s) && low=$(foretold_of "$r" render_low_s) &&
            high=$(foretold_of "$r" render_high_s) || exit 1
        told="$told $s" lows="$lows $low" highs="$highs $high"
    done
    rmse=$(value "$r" estimated_rmse) later=$(value "$WORK/run.json" estimated_rmse)
    equal=$goal
    case $setting in samples=*) equal=$later ;; esac
    cpu=$(median_of $cpu) took=$(median_of $took)
    # For a run with the predicted samples, the power law converts the forecast from the goal to the error that
    # the run has reached. For a run with a target, the forecast for the target is what such a run is predicted
    # to take, although it ends below the target. If the slope may as well be 0, or its spread is unknown, the
    # interval has no upper end.
    at_equal=$(awk -v e="$rmse" -v g="$equal" -v t="$cpu" -v took="$took" -v b="$slope" \
        -v d="$(of "$r" forecast slope_spread)" '
        function at(b) { return t * (e / g) ^ (-1 / b) }
        BEGIN { if (e == "" || g == "" || t == "" || took == "" || b == "" || d == "") exit 1
            low = d == "null" ? t : at(b - d); high = d == "null" || b + d >= 0 ? 1e9 : at(b + d)
            printf "%.3f,%.3f,%s,%s,%.3f\n", at(b), low, high < 1e9 ? sprintf("%.3f", high) : "inf",
                took, at(b) / took - 1 }')
    put_row "$scene,$setting,$rmse,$cpu,$later,$at_equal,$goal,$(foretold_median $told),$(foretold_median $lows),$(foretold_median $highs)" "8 14"
}

forecast_table() {
    echo "# Forecasts: CPU seconds to a lower error, $W x $H"
    echo
    echo "## What was foretold"
    echo
    echo "Goal, foretold s and low to high are what the run's report says, its wall seconds of rendering in CPU seconds; took s is what a run takes with the samples that it names for the goal, or with the goal as its target. Such a run ends above or below the goal: reached / goal says by how much, and a time that fits may belong to another error."
    echo
    echo "| scene | run | RMSE | CPU s | goal | reached / goal | foretold s (low to high) | took s | within 20 % | within low to high |"
    echo "|---|---|---|---|---|---|---|---|---|---|"
    awk -F, 'function s(t) { return t == "inf" ? t : sprintf("%.2f", t) }
        NR > 1 { fits = $12 < 1.2 * $9 && $12 > 0.8 * $9; holds = $13 <= $9 && ($14 == "inf" || $9 <= $14)
            printf "| %s | %s | %.3g | %.2f | %.3g | %.2f | %.2f (%.2f to %s) | %.2f | %s | %s |\n", $1, $2, $3, $4, $11, $5 / $11, $12, $13, s($14), $9, fits ? "yes" : "no", holds ? "yes" : "no"
            n++; hit += fits; if ($14 == "inf") open++; else in1 += holds; reached += $5 <= $11; near += $5 <= 1.05 * $11 }
        END { if (n) printf "\nWithin 20 %%: %d of %d. Within low to high: %d of %d (%d more have no upper end). Goal reached: %d of %d, to within 5 %% %d.\n", hit, n, in1, n - open, open, reached, n, near }' "$csv"
    echo
    echo "## At equal error"
    echo
    echo "Of runs that name samples, foretold is carried along the foretold slope to the error that the later run came to, so that time is compared with time for the same error. Of runs with a target it is what was foretold."
    echo
    echo "| scene | run | RMSE | CPU s | later RMSE | foretold s | interval of a standard deviation | took s | off by |"
    echo "|---|---|---|---|---|---|---|---|---|"
    awk -F, 'NR > 1 { printf "| %s | %s | %.3g | %.2f | %.3g | %.2f | %.2f to %s | %.2f | %+.0f %% |\n", $1, $2, $3, $4, $5, $6, $7, $8 == "inf" ? $8 : sprintf("%.2f", $8), $9, 100 * $10
            n++; hit += $10 < 0.2 && $10 > -0.2; if ($8 == "inf") open++; else in1 += $7 <= $9 && $9 <= $8; s += log(1 + $10) ^ 2
            if ($6 > $4 && $9 > $4) { more += log(($6 - $4) / ($9 - $4)) ^ 2; m++ } }
        END { if (n) printf "\nWithin 20 %%: %d of %d. In their interval: %d of %d (%d more have no upper end). Off by, root mean square: %.0f %% of all, %.0f %% of what was still to come (in %d of them; of the others nothing was, or nothing was foretold).\n", hit, n, in1, n - open, open, 100 * sqrt(s / n), m ? 100 * sqrt(more / m) : 0, m }' "$csv"
}

plot_forecast() {
    [ "$(wc -l <"$csv")" -gt 1 ] || return 0
    plot <<END
$LOGLOG
set output "$OUT/error_forecast.svg"
set xlabel "CPU seconds that it took"
set ylabel "foretold, for what was reached, +- a standard deviation"
set key left top
set title "Forecasts, $W x $H; the lines: as foretold, and 20 % off"
plot for [scene in "$SCENES"] sprintf("< grep '^%s,' $csv", scene) using 9:6:7:(strcol(8) eq "inf" ? \$6 : \$8) with yerrorbars pt 7 title scene, \
     x with lines lc 0 notitle, 0.8 * x with lines lc 0 dt 2 notitle, 1.2 * x with lines lc 0 dt 2 notitle
END
}
