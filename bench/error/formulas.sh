# The paper's formulas beside the exact ones.

formulas() {
    begin_csv formulas "$SIZE $REPEAT" "scene,exact_s,paper_s,rmse,max"
    for scene in $SCENES distant shells slab; do
        known "$scene" && continue
        farm_repeated exact "$scene" sampling.samples=4
        exact_s=$cpu
        farm_repeated run "$scene" sampling.samples=4 render.formulas=paper sampling.reference="$WORK/exact.pfm"
        put_row "$scene,$exact_s,$cpu,$(of "$WORK/run.json" reference rmse),$(of "$WORK/run.json" reference max)"
    done
    {
        echo "# The paper's formulas against the exact ones, same samples"
        echo
        echo "| scene | exact, CPU s | paper, CPU s | RMSE of the paper's | largest |"
        echo "|---|---|---|---|---|"
        awk -F, 'NR > 1 { printf "| %s | %.3f | %.3f | %.3g | %.3g |\n", $1, $2, $3, $4, $5 }' "$csv"
    } >"$OUT/error_formulas.md"
}
