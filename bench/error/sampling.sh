# Uniform and adaptive sampling, against a reference.

sampling() {
    begin_csv sampling "$SIZE $FINEST $REPEAT" "scene,method,setting,samples,cpu_s,rmse,max,p999,estimated,low,high"
    for scene in $SCENES; do
        reference_of "$scene"
        # In turns, so that changes in the speed of the machine affect both methods alike.
        for n in $(awk "BEGIN { for (n = 2; n < $FINEST; n *= 2) print n; print $FINEST }"); do
            one_sampling "$scene" uniform $n sampling.samples=$n
            # The targets are the errors of the uniform pictures from 4 samples on.
            [ "$n" -gt 2 ] || continue
            target=$(awk -F, -v s="$scene" -v n=$n '$1 == s && $2 == "uniform" && $3 == n { print $6 }' "$csv")
            one_sampling "$scene" adaptive "$target" sampling.target_error="$target"
        done
    done
    sampling_tables >"$OUT/error_sampling.md"
    for scene in $SCENES; do plot_sampling "$scene"; done
}

one_sampling() { # SCENE METHOD SETTING OVERRIDE
    known "$1,$2,$3" && return
    farm_if_short_repeated run "$1" "$4" sampling.reference="$reference.pfm"
    r=$WORK/run.json
    put_row "$1,$2,$3,$(value "$r" samples_per_pixel),$cpu,$(of "$r" reference rmse),$(of "$r" reference max),$(of "$r" reference p999),$(value "$r" estimated_rmse),$(value "$r" estimated_low),$(value "$r" estimated_high)"
}

sampling_tables() {
    echo "# Error against run time: uniform and adaptive sampling, $W x $H"
    echo
    echo "References have $MANY samples per pixel. Their own RMSE, estimated:"
    for scene in $SCENES; do
        echo "$scene $(value "$(reference_at "$scene").json" estimated_rmse)"
    done | awk '{ printf "%s%s %.2g", (NR > 1 ? ", " : ""), $1, $2 } END { print "." }'
    echo
    echo "Pareto front (no other setting has less of both error and time), slope of RMSE against CPU time:"
    echo
    echo "| scene | method | setting | samples | CPU s | RMSE | estimated | interval holds | front |"
    echo "|---|---|---|---|---|---|---|---|---|"
    awk -F, 'NR > 1 { n++; for (i = 1; i <= 11; i++) f[n, i] = $i }
        END { for (k = 1; k <= n; k++) { front = "yes"
            for (j = 1; j <= n; j++) if (f[j, 1] == f[k, 1] && f[j, 5] < f[k, 5] && f[j, 6] < f[k, 6]) front = ""
            printf "| %s | %s | %.3g | %.1f | %.2f | %.3g | %.3g | %s | %s |\n", f[k, 1], f[k, 2], f[k, 3], f[k, 4], f[k, 5], f[k, 6], f[k, 9], (f[k, 10] <= f[k, 6] && f[k, 6] <= f[k, 11]) ? "yes" : "no", front } }' "$csv"
    echo
    echo "Equal error: CPU seconds that uniform sampling needs for what adaptive reaches, interpolated on logarithmic axes (~: extrapolated, beyond the coarsest or finest uniform picture); equal time the same way round."
    echo
    echo "| scene | adaptive RMSE | adaptive s | uniform s | time ratio | uniform RMSE in that time | error ratio |"
    echo "|---|---|---|---|---|---|---|"
    awk -F, '# Y at x of a scene with m pictures; sets far to a mark when x is beyond them.
        function at(x, X, Y, s, m,   i) {
            far = ""
            for (i = 1; i < m; i++) if ((x - X[s, i]) * (x - X[s, i + 1]) <= 0) break
            if (i == m) { far = "~"; i = (x - X[s, 1]) * (X[s, m] - X[s, 1]) < 0 ? 1 : m - 1 }
            return exp(log(Y[s, i]) + (log(x) - log(X[s, i])) * (log(Y[s, i + 1]) - log(Y[s, i])) / (log(X[s, i + 1]) - log(X[s, i]))) }
        $2 == "uniform" { m[$1]++; T[$1, m[$1]] = $5; E[$1, m[$1]] = $6 }
        $2 == "adaptive" { n++; scene[n] = $1; cpu[n] = $5; rmse[n] = $6 }
        END { for (k = 1; k <= n; k++) { s = scene[k]
            t = at(rmse[k], E, T, s, m[s]); t_far = far; e = at(cpu[k], T, E, s, m[s])
            printf "| %s | %.3g | %.2f | %s%.2f | %s%.2f | %s%.3g | %s%.2f |\n", s, rmse[k], cpu[k], t_far, t, t_far, t / cpu[k], far, e, far, e / rmse[k] } }' "$csv"
    echo
    awk -F, 'NR > 1 { k = $1 " " $2; x = log($5); y = log($6); n[k]++; sx[k] += x; sy[k] += y; xx[k] += x * x; xy[k] += x * y; yy[k] += y * y }
        END { for (k in n) if (n[k] > 2) { d = n[k] * xx[k] - sx[k] ^ 2; b = (n[k] * xy[k] - sx[k] * sy[k]) / d
            r = (yy[k] - sy[k] ^ 2 / n[k] - b * b * d / n[k]) / (n[k] - 2); if (r < 0) r = 0
            printf "* slope of %s: %.2f +- %.2f\n", k, b, sqrt(r * n[k] / d) } }' "$csv" | sort
}

plot_sampling() {
    plot <<END
$LOGLOG
set output "$OUT/error_sampling_$1.svg"
set xlabel "CPU seconds"
set ylabel "RMSE"
set format y "%g"
set title "$1, $W x $H"
plot "< grep '^$1,uniform' $csv" using 5:6 with linespoints pt 7 title "uniform", \
     "< grep '^$1,adaptive' $csv" using 5:6 with linespoints pt 5 title "adaptive"
END
}
