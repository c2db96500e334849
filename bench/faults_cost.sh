# faults_cost.sh PAIRS [FOLDER FOR TABLES]: measures what the journal costs.
#
# Pairs of runs on one process, with and without output.journal, in alternating order. The results are the medians over
# the pairs of the ratios of CPU time (of the whole process, including reading and writing) and of the wall time of
# rendering. Both are meaningful on a quiet machine only. One further run measures the CPU time of the thread that
# writes the journal, which other programs do not affect. FARM, COST_SCENE and COST_SIZE select what is rendered.
set -u
export LC_ALL=C # figures with a decimal point
. "$(dirname "$0")/report.sh"
pairs=${1:-7} out=${2:-}
FARM=$(realpath "${FARM:-./farm}")
SCENE=$(realpath "${COST_SCENE:-config/lantern.ini}")
SIZE=${COST_SIZE:-sampling.samples=25}
[ -z "$out" ] || out=$(realpath "$out")
T=$(mktemp -d)
trap 'rm -rf "$T"' EXIT
trap 'exit 1' INT TERM
cd "$T" || exit 1

# one NAME JOURNAL: appends "CPU-seconds render-seconds" to NAME
one() {
    # The second line that times prints has the user and system time of child processes.
    # shellcheck disable=SC2086 # a list of settings
    cpu=$(
        "$FARM" "$SCENE" $SIZE output.image=a.pfm output.report=a.json output.journal="$2" \
            >/dev/null 2>e || { cat e >&2; exit 1; }
        times >t # of this shell, which a pipe would not be
        awk 'NR == 2 { for (i = 1; i <= 2; i++) { split($i, t, /[ms]/); s += 60 * t[1] + t[2] } print s }' t
    ) || exit 1
    echo "$cpu $(of a.json time render_s)" >>"$1"
}

for i in $(seq "$pairs"); do
    if [ $((i % 2)) -eq 0 ]; then one with a.journal; one without ""; else one without ""; one with a.journal; fi
done

# Reads the thread's CPU time so far, in nanoseconds, as long as the thread exists.
"$FARM" "$SCENE" $SIZE output.image=a.pfm output.report=a.json output.journal=a.journal >/dev/null 2>&1 &
farm=$!
while kill -0 $farm 2>/dev/null; do
    for task in /proc/$farm/task/*; do
        { [ "$(cat "$task/comm")" = journal ] && cat "$task/schedstat" >now && [ -s now ] && mv now spent; } 2>/dev/null
    done
    sleep 0.1
done
wait $farm || exit 1
[ -s spent ] || { echo "faults_cost.sh: no thread of a journal was seen" >&2; exit 1; }
render=$(value a.json cpu_s head)

ratio() { paste -d ' ' with without | awk -v c="$1" '{ print $c / $(c + 2) }' | median; }
{
    echo "pair,with_cpu_s,with_render_s,without_cpu_s,without_render_s"
    paste -d ' ' with without | awk -v OFS=, '{ print NR, $1, $2, $3, $4 }'
} >cost.csv
{
    echo "| journal's cost, $pairs pairs | without, s | with, s | ratio, median of pairs |"
    echo "|---|---|---|---|"
    echo "| CPU time of the run | $(cut -d ' ' -f 1 without | median) | $(cut -d ' ' -f 1 with | median) | $(ratio 1) |"
    echo "| render wall time | $(cut -d ' ' -f 2 without | median) | $(cut -d ' ' -f 2 with | median) | $(ratio 2) |"
    awk -v render="$render" '{
        printf "| CPU time: rendering, thread of the journal | %s | %.4f | %.5f |\n",
            render, $1 / 1e9, $1 / 1e9 / render }' spent
} >cost.md
cat cost.md
[ -z "$out" ] || { cp cost.csv "$out/faults_cost.csv" && cp cost.md "$out/faults_cost.md"; }
