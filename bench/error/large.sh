# Adaptive sampling of large pictures, judged by some of their pixels.

. "$HERE/error/lattice.sh"

large() {
    begin_csv large "$LARGE" "scene,samples,uniform_s,uniform_wall_s,uniform_estimated,slope,adaptive_samples,adaptive_s,adaptive_wall_s,adaptive_estimated,uniform_rmse,uniform_deviation,adaptive_rmse,adaptive_deviation,reference_rmse"
    set_size "$LARGE"
    for pair in $LARGE_SAMPLES; do
        scene=${pair%=*} n=${pair#*=}
        known "$scene,$n" && continue
        farm_wide even "$scene" sampling.samples=$n
        u=$WORK/even.json a=$WORK/run.json
        farm_wide run "$scene" sampling.target_error="$(value "$u" estimated_rmse)"
        errors=$(lattice_errors "$scene" $n) || exit 1
        put_row "$scene,$n,$(cpu_of "$u"),$(of "$u" time render_s),$(value "$u" estimated_rmse),$(of "$u" forecast slope),$(value "$a" samples_per_pixel),$(cpu_of "$a"),$(of "$a" time render_s),$(value "$a" estimated_rmse),$errors"
    done
    {
        echo "# Adaptive sampling of large pictures, $W x $H"
        echo
        echo "The adaptive picture's goal is the error that the uniform one estimates. True errors are those of some $LATTICE pixels, evenly spread, against 64 times the samples of the uniform picture, whose own RMSE is beside them; +- tells by how much another choice of pixels would differ. CPU seconds are those of rendering, all ranks together; in wall seconds of rendering with -n $(nproc) plans between passes count, too. Ratios: uniform / adaptive of both, for the adaptive picture's true RMSE, to which uniform sampling is carried along the slope of error against time that its run tells."
        echo
        echo "| scene | uniform samples | CPU s | wall s | RMSE estimated | true | adaptive samples | CPU s | wall s | RMSE estimated | true | reference | CPU ratio | wall ratio |"
        echo "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|"
        awk -F, 'NR > 1 { more = ($13 / $11) ^ (1 / $6)
            printf "| %s | %s | %.1f | %.1f | %.3g | %.3g +- %.2g | %.1f | %.1f | %.1f | %.3g | %.3g +- %.2g | %.2g | %.2f | %.2f |\n",
            $1, $2, $3, $4, $5, $11, $12, $7, $8, $9, $10, $13, $14, $15, $3 / $8 * more, $4 / $9 * more }' "$csv"
    } >"$OUT/error_large.md"
}
