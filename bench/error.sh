# Error against run time. Sections, all of them unless named as arguments:
#
#   allocation  what the best allocation of samples to pixels could gain over equal numbers for all pixels
#   sampling  uniform and adaptive sampling of four scenes, against a reference with 64 times the
#             samples of the finest uniform picture: Pareto front, equal error, equal time
#   large     the same for pictures that are too large for a reference of all pixels: they are judged by some pixels
#   limits    runs under a time limit: by how much it is exceeded, and the error compared with uniform sampling
#   truncation  max_depth from 0 to 20 and cutoff from 1/16 to 1/65536: error, claimed bound
#   formulas  the paper's formulas compared with the exact ones
#   forecast  what a run predicts half of its error to cost, compared with what it costs: for the predicted number
#             of samples, and for the error that was reached
#   coverage  how often intervals contain the error, over pictures with different random numbers, also of specks
#             that samples hit only by chance
#   fields    how well errors are estimated, and how often intervals hold, for objects that few samples hit: in
#             synthetic pictures that need no rays
#   peers     POV-Ray's and Tachyon's antialiasing, each against its own converged picture
#
# Times are CPU seconds of rendering; for short runs they are the median of ERROR_REPEAT (3) runs. FARM and TOOL are the
# programs, WORK is a folder for pictures; MPIEXEC starts references on all cores. These can be set, too: ERROR_SCENES,
# ERROR_SIZE (320x240), ERROR_PEERS_SIZE (160x120), ERROR_FINEST (16: most uniform samples per pixel), ERROR_LARGE
# (1920x1440), ERROR_LARGE_SAMPLES (lantern=64 garden=64), ERROR_LIMITS (1 2 5 10), ERROR_LIMITS_SIZE (640x480),
# ERROR_FIELDS (400), and SCENES: a folder whose scene files can be named in ERROR_SCENES, without their extensions.
# Tables and plots go to bench/out/.
#
# Measurements stay in the CSV files, except those of allocation and fields. A section that was interrupted continues at
# its next row if settings, programs and scene files are the same; otherwise it begins anew. Status 1: something could
# not be measured or drawn, which ends the bench; or, after everything else, a bound of truncation did not hold.
set -u
export LC_ALL=C
SECTIONS=${*:-allocation sampling large limits truncation formulas forecast coverage fields peers}
FOLDER=${SCENES:-}
SCENES=${ERROR_SCENES:-lantern garden ground balls}
COVERED=${ERROR_SCENES:-$SCENES specks dust}
SIZE=${ERROR_SIZE:-320x240} PEERS_SIZE=${ERROR_PEERS_SIZE:-160x120}
FINEST=${ERROR_FINEST:-16} REPEAT=${ERROR_REPEAT:-3}
MANY=$((64 * FINEST))        # of a reference
LARGE=${ERROR_LARGE:-1920x1440} LARGE_SAMPLES=${ERROR_LARGE_SAMPLES:-lantern=64 garden=64}
LIMITS=${ERROR_LIMITS:-1 2 5 10} LIMITS_SIZE=${ERROR_LIMITS_SIZE:-640x480}
OUT=bench/out
set_size() { W=${1%x*} H=${1#*x}; }
set_size "$SIZE"
KEPT=$WORK/references
broken=0 # bounds
mkdir -p "$WORK/peers" "$KEPT" "$OUT"

# Rows and references of other programs or scene files are invalid.
scene_files() {
    find -L config ${FOLDER:+"$FOLDER"} -type f \
        \( -name '*.ini' -o -name '*.nff' -o -name '*.obj' -o -name '*.mtl' \) -exec cksum {} + | sort
}
STATE="$FOLDER $(cksum <"$FARM") $(cksum <"$TOOL") $(scene_files | cksum)"
# renew FILE SETTINGS OUTPUT...: removes the outputs if programs, scene files or settings differ from those recorded in
# FILE, and records the present ones there.
renew() {
    told=$1 state="$STATE $2"; shift 2
    [ "$(cat "$told" 2>/dev/null)" = "$state" ] && return
    rm -f "$@"
    echo "$state" >"$told"
}
renew "$KEPT/state" "" "$KEPT"/ref_*.pfm "$KEPT"/ref_*.json "$KEPT"/deep_*.pfm "$KEPT"/deep_*.json \
    "$WORK/balls.ini" "$WORK/specks.ini" "$WORK/dust.ini"

# begin_csv SECTION SETTINGS NAMES-OF-COLUMNS: begins the CSV file of a section. Its old rows are kept if they were
# measured with the same settings and have the same columns.
begin_csv() {
    csv=$OUT/error_$1.csv
    renew "$OUT/.error_$1" "$2 $3" "$csv"
    [ -e "$csv" ] || echo "$3" >"$csv"
}
# put_row FIELD,... [N...]: appends a row. Ends the bench if a field is empty or not a finite number, as the program
# that measures it must have failed. Field N may be a bound that does not exist: null or inf.
put_row() {
    echo "$1" | awk -F, -v open=" ${2:-} " '
        { for (i = 1; i <= NF; i++) if ($i == "" || $i ~ /^[-+]?nan$/ || (!index(open, " " i " ") && $i ~ /^([-+]?inf|null)$/)) exit 1 }' || {
        echo "error.sh: not all of a row of $csv was measured: $1" >&2
        exit 1
    }
    echo "$1" >>"$csv"
}
# known BEGINNING: whether there is a row that begins with these fields.
known() { awk -v begin="$1," 'index($0, begin) == 1 { found = 1 } END { exit !found }' "$csv"; }

# specks COUNT THICKNESS: a scene of COUNT objects at random places, half of them balls and half needles, which adaptive
# sampling hits only by chance. With THICKNESS 1, at 200 x 150, balls are a third of a pixel wide and needles a twelfth.
specks() {
    cat <<'END'
[camera]
eye = 0 0 6
look_at = 0 0 0
fov = 30
[background]
color = 0.1 0.1 0.1
[material bright]
color = 1 0.3 0.5
ambient = 1
diffuse = 0
END
    awk -v count="$1" -v thick="$2" 'function part(x) { return x - int(x) }
        BEGIN { for (i = 1; i <= count; i++) {
            x = 4.2 * (part(i * 0.7548776662466927) - 0.5); y = 3.15 * (part(i * 0.5698402909980532) - 0.5)
            turn = 6.28 * part(i * 0.618033988749895); u = 0.05 * cos(turn); v = 0.05 * sin(turn)
            if (i % 2) printf "[sphere %d]\ncenter = %.9f %.9f 0\nradius = %g\nmaterial = bright\n", i, x, y, 0.0034 * thick
            else printf "[cylinder %d]\nbase = %.9f %.9f 0\napex = %.9f %.9f 0\nradius = %g\nmaterial = bright\n",
                i, x - u, y - v, x + u, y + v, 0.00086 * thick
        } }'
}

config_of() {
    for ending in ini nff obj; do
        [ -n "$FOLDER" ] && [ -e "$FOLDER/$1.$ending" ] && echo "$FOLDER/$1.$ending" && return
    done
    case $1 in
    lantern | garden) echo "config/$1.ini" ;;
    specks) [ -e "$WORK/specks.ini" ] || specks 1200 1 >"$WORK/specks.ini"; echo "$WORK/specks.ini" ;;
    dust) [ -e "$WORK/dust.ini" ] || specks 300 0.5 >"$WORK/dust.ini"; echo "$WORK/dust.ini" ;; # few are met
    balls) [ -e "$WORK/balls.ini" ] || "$TOOL" scene "$WORK" balls; echo "$WORK/balls.ini" ;;
    *) echo "config/extreme/$1.ini" ;;
    esac
}

# For gnuplot: the axes of all plots. Seconds have tics at 1, 2 and 5 times powers of ten, as a plot covers one or two
# octaves of them.
LOGLOG='load "bench/plot.gp"
set logscale xy
set for [e=-3:4] xtics add (sprintf("%g", 10.0 ** e) 10.0 ** e, sprintf("%g", 2 * 10.0 ** e) 2 * 10.0 ** e, \
    sprintf("%g", 5 * 10.0 ** e) 5 * 10.0 ** e)
set autoscale xfix
set offsets graph 0.05, graph 0.05
set rmargin 4'

# Runs gnuplot with the commands from standard input.
plot() { gnuplot || { echo "error.sh: gnuplot failed" >&2; exit 1; }; }

# value FILE KEY: a number of a report.
value() { sed -n "s/.*\"$2\": \"\\{0,1\\}\\([^\",}]*\\).*/\\1/p" "$1" | "${3:-tail}" -n 1; }
# of FILE OBJECT KEY: a number in an object of a report.
of() { sed -n "/^  \"$2\": {/,/^  }/s/.*\"$3\": \"\{0,1\}\([^\",}]*\).*/\1/p" "$1" | head -n 1; }
# cpu_of FILE: CPU seconds of rendering, serving and planning in a report.
cpu_of() { sed -n 's/.*"cpu_s": \([0-9.]*\),.*/\1/p' "$1" | awk '{ s += $1 } END { print s }'; }

# farm NAME SCENE OVERRIDE...: renders to $WORK/NAME.pfm and .json
farm() {
    name=$1 config=$(config_of "$2"); shift 2
    "$FARM" "$config" image.width=$W image.height=$H output.image="$WORK/$name.pfm" \
        output.report="$WORK/$name.json" output.journal= "$@" >"$WORK/$name.log" 2>&1 ||
        { cat "$WORK/$name.log" >&2; exit 1; }
}

# The median of numbers, one per line.
median() { sort -n | awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }'; }
median_of() { for t; do echo "$t"; done | median; }
# Calls farm() REPEAT times; sets cpu to the median of its CPU seconds.
farm_repeated() {
    times=
    for _ in $(seq "$REPEAT"); do
        farm "$@"
        times="$times $(cpu_of "$WORK/$1.json")"
    done
    cpu=$(median_of $times)
}
# The same for runs that take at most SHORT CPU seconds; longer ones are made once.
SHORT=2
farm_if_short_repeated() {
    farm "$@"
    cpu=$(cpu_of "$WORK/$1.json")
    awk "BEGIN { exit !($cpu < $SHORT) }" || return 0
    times=$cpu
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

# ---- allocation ----

allocation() {
    md=$OUT/error_allocation.md
    {
        echo "# What the best allocation of samples could gain, $W x $H"
        echo
        echo "For the RMSE that so many samples in every pixel leave: how many times the CPU time of the best"
        echo "allocation of samples to pixels they take. By the formula, whatever share of a sample a pixel"
        echo "is given; and with 2, 4, 8, ... samples, at least 2 and at least 4, chosen by half of 16 pictures"
        echo "and told by the other half. The formula tells rather too much: where measured errors of pixels"
        echo "scatter, that looks like something to be gained. The others tell rather too little: the variance of"
        echo "few pictures chooses, and nothing between these numbers nor above 256."
        echo
        echo "| scene | samples | RMSE | slope p of the squared error | by the formula | from 2 samples on | from 4 on |"
        echo "|---|---|---|---|---|---|---|"
        for scene in $SCENES; do
            "$TOOL" allocation "$scene" "$(config_of "$scene")" image.width=$W image.height=$H || exit 1
        done
    } >"$md"
    cat "$md"
}

# ---- sampling ----

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
    cat "$OUT/error_sampling.md"
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

# ---- pixels of large pictures ----

# The number of pixels that a large picture is judged by. Each is compared with one of 64 times the samples of the
# uniform picture.
LATTICE=16000

# lattice_errors SCENE SAMPLES: fields of a row: the true RMSE of $WORK/even.pfm, which has SAMPLES samples per pixel,
# and the deviation of this RMSE; the same two of $WORK/run.pfm; the RMSE of the reference.
lattice_errors() {
    told=$("$TOOL" lattice "$(config_of "$1")" $LATTICE $((64 * $2)) "$WORK/even.pfm" "$WORK/run.pfm" \
        image.width=$W image.height=$H) || exit 1
    echo $told | tr ' ' ,
}

# ---- large ----

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
    cat "$OUT/error_large.md"
    set_size "$SIZE"
}

# ---- limits ----

limits() {
    begin_csv limits "$LIMITS_SIZE $(nproc)" "scene,limit,total_s,sampled_share,adaptive_samples,adaptive_s,adaptive_estimated,uniform_samples,uniform_s,slope,uniform_rmse,uniform_deviation,adaptive_rmse,adaptive_deviation,reference_rmse,guessed_rmse"
    set_size "$LIMITS_SIZE"
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
    } >"$OUT/error_limits.md"
    plot_limits
    cat "$OUT/error_limits.md"
    set_size "$SIZE"
}

one_limit() { # SCENE LIMIT
    u=$WORK/even.json a=$WORK/run.json
    farm_wide run "$1" sampling.time_limit="$2" output.image="$WORK/run.png"
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

# ---- truncation ----

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
    cat "$OUT/error_truncation.md"
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

# ---- formulas ----

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
    cat "$OUT/error_formulas.md"
}

# ---- peers ----

# timed PICTURE COMMAND...: CPU seconds of a command that makes the picture, including loading. It runs in WORK, as
# neither POV-Ray nor Tachyon accepts names with blanks.
timed() {
    made=$1; shift
    spent=$(cd "$WORK" && rm -f "$made" && "$@" >peer.log 2>&1 && [ -s "$made" ] && times) ||
        { cat "$WORK/peer.log" >&2; echo "error.sh: $1 made no picture" >&2; return 1; }
    echo "$spent" | tail -n 1 | tr ms '  ' | awk '{ print 60 * $1 + $2 + 60 * $3 + $4 }'
}
povray_to() { # OUT OPTION...
    to=${1#"$WORK"/}; shift
    timed "$to" povray +WT1 -D -V +Q9 +FP16 File_Gamma=1 +W$W +H$H +I"$scene.pov" +O"$to" "$@"
}
tachyon_to() {
    to=${1#"$WORK"/}; shift
    timed "$to" tachyon -numthreads 1 -fullshade -shade_phong -format PPM48 -o "$to" "$scene.dat" "$@"
}

povray_loads() { (set_size 4x3; povray_to load.ppm -A); }
tachyon_loads() { tachyon_to load.ppm -res 4 3; }

# The name of a peer's converged picture of an exported scene. It takes minutes and does not depend on the farm, so it
# is kept.
converged_of() { echo "$WORK/peers/${W}x${H}_$(cksum <"$1" | tr ' ' _).ppm"; }
# converge PICTURE COMMAND OPTION...: makes the converged picture unless it exists. It is complete or does not exist.
converge() {
    picture=$1 peer=$2; shift 2
    [ -s "$picture" ] && return
    "$peer" "$picture.part.ppm" "$@" >/dev/null && mv "$picture.part.ppm" "$picture" || exit 1
}

# beside_load LOADING PICTURE: the CPU seconds that the second command takes beyond the first one, which loads the same
# scene for a few pixels: the median of REPEAT pairs, as the machine's speed changes. 0: the time of loading scatters by
# more than this difference.
beside_load() {
    more=
    for _ in $(seq "$REPEAT"); do
        load=$($1) && t=$($2) || return 1
        more="$more $(awk "BEGIN { print $t - $load }")"
    done
    median_of $more | awk '{ print ($1 > 0 ? $1 : 0) }'
}

peers() {
    begin_csv peers "$PEERS_SIZE $FINEST $REPEAT" "scene,program,setting,cpu_s,rmse"
    set_size "$PEERS_SIZE"
    for scene in $SCENES; do
        config=$(config_of "$scene")
        for kind in pov dat; do
            "$TOOL" export "$config" "$WORK/$scene.$kind" image.width=$W image.height=$H || exit 1
        done
        pov_rows
        tachyon_rows
        farm_rows
    done
    peers_apart
    peers_table >"$OUT/error_peers.md"
    for scene in $SCENES; do plot_peers "$scene"; done
    cat "$OUT/error_peers.md"
    set_size "$SIZE"
}

# Each measures the rows of one program, of $scene.
pov_rows() {
    converged=$(converged_of "$WORK/$scene.pov")
    converge "$converged" povray_to +A0.0 +AM1 +R16 -J
    for setting in "-A" "+A0.3 +AM1 +R3" "+A0.1 +AM1 +R3" "+A0.03 +AM1 +R4" "+A0.3 +AM2 +R3" \
                   "+A0.1 +AM2 +R3" "+A0.03 +AM2 +R4" "+A0.01 +AM2 +R5"; do
        known "$scene,POV-Ray,$setting" && continue
        t=$(beside_load povray_loads "povray_to t.ppm $setting") || exit 1
        put_row "$scene,POV-Ray,$setting,$t,$("$TOOL" compare "$WORK/t.ppm" "$converged")"
    done
}
tachyon_rows() {
    converged=$(converged_of "$WORK/$scene.dat")
    converge "$converged" tachyon_to -aasamples 255
    for n in 0 3 8 15 31; do
        known "$scene,Tachyon,-aasamples $n" && continue
        t=$(beside_load tachyon_loads "tachyon_to t.ppm -aasamples $n") || exit 1
        put_row "$scene,Tachyon,-aasamples $n,$t,$("$TOOL" compare "$WORK/t.ppm" "$converged")"
    done
}
farm_rows() {
    reference_of "$scene"
    # "one": one ray through the middle of each pixel.
    for target in one 0.1 0.06 0.04 0.025 0.016 0.01 0.006 0.004 0.0025 0.0016; do
        known "$scene,farm,$target" && continue
        if [ "$target" = one ]; then
            farm_repeated run "$scene" sampling.samples=1
        else
            farm_repeated run "$scene" sampling.target_error=$target sampling.min_samples=2
        fi
        put_row "$scene,farm,$target,$cpu,$("$TOOL" compare "$WORK/run.pfm" "$reference.pfm")"
    done
}

# Sets apart: the RMSE between the converged picture that each peer has of each scene and that of the farm.
peers_apart() {
    apart=
    for scene in $SCENES; do
        told="$scene"
        for kind in pov dat; do
            off=$("$TOOL" compare "$(converged_of "$WORK/$scene.$kind")" "$(reference_at "$scene").pfm") || exit 1
            case $kind in pov) told="$told POV-Ray" ;; *) told="$told, Tachyon" ;; esac
            told="$told $(printf %.2g "$off")"
        done
        apart="$apart${apart:+; }$told"
    done
}

peers_table() {
    echo "# Antialiasing beside POV-Ray and Tachyon, $W x $H, each against its own converged picture"
    echo
    echo "Components clamped to 0..1, as the peers store them. The farm samples with sampling.min_samples=2 in place of the default of 4, which gives it coarser pictures, too, as the peers have them. Its time for the same RMSE is interpolated on logarithmic axes between its own pictures (<: its coarsest is better already). Peers get the scenes enlarged so that their tolerances do no harm; what their converged pictures differ from the farm's by, RMSE:"
    echo "$apart."
    echo
    echo "| scene | program | setting | CPU s | RMSE | farm, CPU s | ratio |"
    echo "|---|---|---|---|---|---|---|"
    awk -F, 'NR > 1 { n++; for (i = 1; i <= 5; i++) f[n, i] = $i }
        END { for (k = 1; k <= n; k++) { if (f[k, 2] == "farm") continue
            lo = 0; hi = 0 # the quickest that is as good, and the best of what is quicker still
            for (j = 1; j <= n; j++) if (f[j, 1] == f[k, 1] && f[j, 2] == "farm" &&
                f[j, 5] <= f[k, 5] && (!lo || f[j, 4] < f[lo, 4])) lo = j
            for (j = 1; j <= n && lo; j++) if (f[j, 1] == f[k, 1] && f[j, 2] == "farm" &&
                f[j, 5] > f[k, 5] && f[j, 4] < f[lo, 4] && (!hi || f[j, 5] < f[hi, 5])) hi = j
            less = ""
            if (!lo) { t = -1 } else if (!hi) { t = f[lo, 4]; less = "<" }
            else t = exp(log(f[lo, 4]) + (log(f[k, 5]) - log(f[lo, 5])) * (log(f[hi, 4]) - log(f[lo, 4])) / (log(f[hi, 5]) - log(f[lo, 5])))
            if (f[k, 4] == 0) { printf "| %s | %s | %s | not told from loading | %.3g | %s | - |\n", f[k, 1], f[k, 2], f[k, 3], f[k, 5], t < 0 ? "-" : sprintf("%s%.2f", less, t); continue }
            printf "| %s | %s | %s | %.2f | %.3g | %s | %s |\n", f[k, 1], f[k, 2], f[k, 3], f[k, 4], f[k, 5], t < 0 ? "-" : sprintf("%s%.2f", less, t), t < 0 ? "-" : sprintf("%s%.1f", less ? ">" : "", f[k, 4] / t) } }' "$csv"
}

plot_peers() {
    plot <<END
$LOGLOG
set output "$OUT/error_peers_$1.svg"
set xlabel "CPU seconds"
set ylabel "RMSE"
set format y "%g"
set title "$1, $W x $H, each against its own converged picture"
plot "< grep '^$1,farm' $csv" using 4:5 with linespoints pt 7 title "farm", \
     "< grep '^$1,POV-Ray' $csv" using 4:5 with points pt 5 title "POV-Ray", \
     "< grep '^$1,Tachyon' $csv" using 4:5 with linespoints pt 9 title "Tachyon"
END
}

# ---- forecast ----

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
    cat "$OUT/error_forecast.md"
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

# ---- coverage ----

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
    cat "$OUT/error_coverage.md"
}

# ---- fields ----

fields() {
    md=$OUT/error_fields.md count=${ERROR_FIELDS:-400}
    {
        echo "# What few samples meet: $count fields of discs, needles and hairs, 96 x 96, to six errors from 0.03 to 0.0015"
        echo
        "$TOOL" fields "$count" || exit 1
    } >"$WORK/fields.md"
    mv "$WORK/fields.md" "$md"
    cat "$md"
}

for section in $SECTIONS; do
    case $section in
    allocation | sampling | large | limits | truncation | formulas | forecast | coverage | fields | peers) "$section" ;;
    *) echo "error.sh: there is no section $section" >&2; exit 2 ;;
    esac
done
[ "$broken" -eq 0 ] || { echo "error.sh: bounds of truncation that do not hold: $broken" >&2; exit 1; }
