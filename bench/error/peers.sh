# POV-Ray's and Tachyon's antialiasing, each against its own converged picture.

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
