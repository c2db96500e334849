# How often intervals hold the true error.

coverage() {
    begin_csv coverage "$SIZE $FINEST" "scene,method,run,rows,held"
    for scene in $COVERED; do
        reference_of "$scene"
        for setting in sampling.samples=8 sampling.target_error=0.006; do
            # Not 10: its region would be part of the reference, with the same random numbers.
            for run in 1 2 3 4 5 6 7 8 9 11; do
                known "$scene,${setting#sampling.},$run" && continue
                farm run "$scene" image.width=$((W + 200 * run)) "image.region=$((100 * run)) 0 $W $H" \
                    "$setting" sampling.reference="$reference.pfm"
                put_row "$scene,${setting#sampling.},$run,$(of "$WORK/run.json" reference rows),$(of "$WORK/run.json" reference rows_held)"
            done
        done
    done
    {
        echo "# Coverage: runs in which every interval of 95 % held the true error"
        echo
        echo "| scene | run | runs | all rows held | rows | held |"
        echo "|---|---|---|---|---|---|"
        awk -F, 'NR > 1 { k = $1 " | " $2; n[k]++; all[k] += $4 == $5; r[k] += $4; h[k] += $5 }
            END { for (k in n) printf "| %s | %d | %d | %d | %d |\n", k, n[k], all[k], r[k], h[k] }' "$csv" | sort
    } >"$OUT/error_coverage.md"
}
