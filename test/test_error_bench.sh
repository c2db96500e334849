# Whether make bench-error notices failures: with a fake farm, which reports the numbers that it is told to, and a fake
# gnuplot, which draws nothing.
. test/lib.sh
BENCH=$(realpath bench/error.sh)
mkdir -p "$T/config" "$T/bin"
cat >"$T/farm" <<'EOT'
#!/bin/sh
for a in "$@"; do case $a in output.image=*) image=${a#*=} ;; output.report=*) report=${a#*=} ;; esac; done
echo picture >"$image"
case $image in */whole.*) bound=${DEEP:-0} ;; *) bound=$BOUND ;; esac
cat >"$report" <<END
{
  "workers": [
    {"rank": 0, "cpu_s": 1.5, "wait_s": 0}
  ],
  "reference": {
    "rmse": $RMSE,
    "max": $MAX
  },
  "bound": {
    "truncation": $bound
  }
}
END
EOT
printf '#!/bin/sh\nexit 0\n' >"$T/tool"
chmod +x "$T/farm" "$T/tool"
gnuplot_ends_with() { printf '#!/bin/sh\ncat >/dev/null\nexit %s\n' "$1" >"$T/bin/gnuplot"; chmod +x "$T/bin/gnuplot"; }

# truncation STATUS RMSE MAX BOUND: runs that section alone, from its beginning.
truncation() {
    rm -rf "$T/work" "$T/bench"
    cd "$T" || return 1
    run "$1" env RMSE="$2" MAX="$3" BOUND="$4" ERROR_SCENES=garden ERROR_REPEAT=1 FARM="$T/farm" \
        TOOL="$T/tool" WORK="$T/work" PATH="$T/bin:$PATH" sh "$BENCH" truncation
}
rows() { tail -n +2 "$T/bench/out/error_truncation.csv" | grep -c "$1"; }

gnuplot_ends_with 0
holds() { truncation 0 0.001 0.1 0.2 && [ "$(rows ',0.2,yes$')" -eq 18 ]; }
check "bounds that hold are all right" holds
unbounded() { truncation 0 0.001 0.1 null && [ "$(rows ',null,-$')" -eq 18 ]; }
check "and so is one that is not there" unbounded
deep() { (export DEEP=0.15; truncation 0 0.001 0.3 0.2) && [ "$(rows ',0.2,yes$')" -eq 18 ]; }
check "what the deep picture may lack itself is allowed for" deep
breaks() {
    truncation 1 0.001 0.3 0.2 && [ "$(rows ',NO$')" -eq 18 ] && [ "$err" = \
        "error.sh: bounds of truncation that do not hold: 18" ]
}
check "one that does not ends the bench with status 1, when all is measured" breaks
# refuses RMSE MAX BOUND
refuses() { truncation 1 "$@" && [ "$(rows .)" -eq 0 ] && echo "$err" | grep -q 'not all of a row'; }
check "what is no number is no row" refuses null 0.1 0.2
check "nor is a largest error that is none" refuses 0.001 null 0.2
check "nor a bound that is none" refuses 0.001 0.1 nan
check "nor infinite errors" refuses inf 0.1 null
gnuplot_ends_with 1
draws() { truncation 1 0.001 0.1 0.2 && echo "$err" | grep -q gnuplot; }
check "a plot that fails ends the bench" draws
finish
