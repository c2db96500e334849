# Adaptive sampling: the picture is the same, bit for bit, for any number of processes and tile size;
# limits are observed, and the report says what they did.
. test/lib.sh
cd "$T" || exit 1
SCENE=$DATA/everything.ini

render() { # IMAGE N OVERRIDE...
    image=$1 n=$2; shift 2
    run 0 farm_n "$n" "$SCENE" output.image="$image" output.report="${image%.*}.json" "$@"
}
# value NAME KEY: a number in the report NAME.json
value() { sed -n "s/^ *\"$2\": \"\\{0,1\\}\\([^\",]*\\)\"\\{0,1\\},\\{0,1\\}\$/\\1/p" "$1.json" | head -1; }
true_rmse() { sed -n '/"reference"/,/}/s/^ *"rmse": \(.*\),$/\1/p' "$1.json"; } # NAME
below() { awk "BEGIN { exit !($1 <= $2) }"; }

check "to a target, without mpiexec" render reference.pfm 0 sampling.target_error=0.0015
check "several passes" test "$(value reference passes)" -gt 2
planned() { # in a part of the time that renderers wait
    awk "BEGIN { exit !($(value reference plan_s) > 0 && $(value reference plan_s) < $(value reference render_s)) }"
}
check "the time of planning" planned
check "ended by the target" test "$(value reference ended)" = target
for n in 1 2 5; do
    for how in "farm.tile=8" "farm.tile=17" "farm.tile=auto" "farm.kernel=portable" \
               "farm.variant=full"; do
        same() {
            render t.pfm "$n" sampling.target_error=0.0015 "$how" && cmp reference.pfm t.pfm
        }
        check "-n $n $how" same
    done
done
same() {
    render t.pfm 3 sampling.target_error=0.0015 farm.master_renders=no && cmp reference.pfm t.pfm
}
check "rank 0 only serves" same

# Whether a light without colour is left out or not makes no difference to the samples of any pixel.
dark() {
    cp "$DATA"/star.* "$DATA"/parts.nff . &&
        { cat "$SCENE"; printf '[light dark]\nposition = 0 9 0\ncolor = 0 0 0\n'; } >dark.ini || return 1
    for variant in auto full; do
        run 0 farm_n 2 dark.ini farm.variant=$variant output.image=$variant.pfm \
            sampling.target_error=0.0015 || return 1
    done
    grep -q '"lights": 2' auto.json && grep -q '"lights": 3' full.json && cmp auto.pfm full.pfm &&
        cmp reference.pfm full.pfm
}
check "a light without colour" dark

# The reference has many more samples, which are independent: those of other pixels of a wider picture that show the
# same view. All intervals of a run hold with a probability of 95 %; as there is no seed, this run always gives the
# same.
check "a reference" run 0 farm_n 2 "$SCENE" image.width=1097 image.region="500 0 97 61" \
    sampling.samples=512 output.image=many.pfm output.report=
true_error() {
    render t.pfm 2 sampling.target_error=0.0015 sampling.reference=many.pfm output.error=rows.csv &&
        below "$(true_rmse t)" 0.002 && grep -q '"true_rmse"' t.json &&
        test "$(value t rows)" -gt 2 && test "$(value t rows)" = "$(value t rows_held)"
}
check "the true error is as estimated" true_error
check "rows as they came" test "$(wc -l <rows.csv)" -gt "$(value t rows)"
uniform() {
    render t.pfm 2 sampling.samples=8 sampling.reference=many.pfm &&
        test "$(value t rows)" = "$(value t rows_held)" && test "$(value t ended)" = samples
}
check "the same number for all pixels" uniform

check "max_samples end it" render t.pfm 2 sampling.target_error=1e-9 sampling.max_samples=8
check "and the report says so" test "$(value t ended)" = max_samples

# Nothing is in view of a picture of one colour: there is nothing to be done in the time, and max_samples end nothing.
# Samples of one colour differ by rounding alone, which is no error of sampling.
blank() { # COLOR PASSES
    printf '[camera]\neye = 0 0 0\nlook_at = 0 0 -1\n[background]\ncolor = %s\n' "$1" >blank.ini &&
        printf '[sphere]\ncenter = 0 0 9\nradius = 1\n' >>blank.ini &&
        run 0 farm_n 2 blank.ini image.width=64 image.height=48 sampling.time_limit=5 && echo "$out" &&
        [ "$(value blank ended)" = no_error ] && [ "$(value blank passes)" -le "$2" ] &&
        case $out in *max_samples* | *"sampling error"*) return 1 ;; *"samples show no error"*) ;; *) return 1 ;; esac
}
check "a black picture shows no error" blank "0 0 0" 1
check "nor does one of another colour" blank "0.3 0.31 0.37" 5

limited() { # N: three seconds, of which a busy machine takes two to start; there it may end later, too, but rendering
    # the run must end in time, up to 5 % by which a busy master may be late
    render t.pfm "$1" sampling.time_limit=3 sampling.max_samples=65536 output.preview=0.2 || return 1
    sed -n '/"time": {/,/}/p' t.json
    began="$(value t init_s) + $(value t load_s) + $(value t resume_s) + $(value t broadcast_s) + $(value t build_s)"
    below "$(value t total_s)" 4.5 && below "$began + $(value t render_s)" 3.15
}
for n in 1 3; do
    check "-n $n, a time limit" limited "$n"
    check "-n $n, ended by it" test "$(value t ended)" = time
done

# Specks in an empty picture: the first pass takes nearly all of the time, and meeting the next goal would take next to
# none.
awk 'BEGIN {
    print "[light]\nposition = 5 9 9\n[image]\nwidth = 160\nheight = 120"
    for (i = 0; i < 40; i++)
        printf "[sphere s%d]\ncenter = %g %g %g\nradius = 0.003\n", i,
            i * 389 % 997 / 997, i * 631 % 991 / 991, i * 53 % 97 / 97
}' >specks.ini
nearly() {
    run 0 farm_n 0 specks.ini sampling.target_error=0.01 output.image=t.pfm || return 1
    echo "$out" | grep -A1 'would take'
    grep -A7 '"forecast"' t.json
    low=$(value t render_low_s) high=$(value t render_high_s)
    below 10 "-1 * $(value t slope)" && below "$(value t render_s) * 1.02" "$high" && below "$low" "$high * 0.98" &&
        case $out in *"would take"*slope*) return 1 ;; *"would take"*) ;; *) return 1 ;; esac
}
check "a forecast of next to nothing scatters as runs do, and has no slope" nearly

# Two pixels, of which one would take for ever: it is rendered until the time is over.
cat >forever.ini <<'END'
[image]
width = 2
height = 1
[camera]
eye = 0 0 0
look_at = 0 0 -1
fov = 90
[render]
max_depth = 60
[light behind]
position = 0 0 9
[material amplifier]
color = 1 1 1
reflection = 1
transmission = 1
[box right]
min = 0.001 -100 -10
max = 100 100 -1
material = amplifier
[box within]
min = 1 -50 -9
max = 90 50 -2
material = amplifier
END
forever() {
    run 0 farm_n 2 forever.ini farm.tile=1 sampling.time_limit=3 output.image=t.pfm || return 1
    grep -E 'render_s|busy_s' t.json
    test "$(value t unsampled_pixels)" = 1 &&
        below "$(value t total_s)" "$(value t render_s) + $(value t init_s) + 1.5" &&
        below 0.4 "$(value t efficiency)" &&
        case $err in *"min_samples"*) return 1 ;; *"has left 1 of "*"guessed from those around"*) ;; *) return 1 ;; esac
}
check "a tile that a time limit ends was rendered until then" forever

# The time limit is too short for the first samples of all pixels: rendering has two fifths of the time that as many
# processes need. The samples must then be spread over the picture, with an error of 0.012 to 0.014. It would be 0.029
# if only the expensive tiles had samples, and the rest showed the pre-pass.
spread() { # N
    run 0 farm_n "$1" "$SCENE" image.width=640 image.height=400 sampling.samples=16 output.image=even.pfm || return 1
    limit=$(awk "BEGIN { limit = $(value even total_s) - 0.6 * $(value even render_s); print limit < 20 ? limit : 20 }")
    echo "limit $limit s"
    run 0 farm_n "$1" "$SCENE" output.image=t.pfm output.report=t.json image.width=640 image.height=400 \
        sampling.time_limit="$limit" sampling.min_samples=16 output.preview=0.5 sampling.reference=even.pfm || return 1
    grep -E '"passes"|unsampled|"rmse"|_s"' t.json
    test "$(value t passes)" -gt 1 && test "$(value t unsampled_pixels)" -gt 1000 &&
        true=$(true_rmse t) &&
        below "$true" 0.02 && below "$true" "1.5 * $(value t guessed_rmse)" &&
        below "$(value t guessed_rmse)" "3 * $true" &&
        case $err in *"guessed from those around"*"sampling.min_samples = 4 would leave fewer"*) ;; *) return 1 ;; esac
}
for n in 1 2 5; do
    check "-n $n, a limit within the first pass" spread "$n"
done

# A run that renders nothing writes no picture, so that an older one stays, and leaves no journal.
too_short() {
    echo old >short.png
    run 1 farm_n 2 "$SCENE" output.image=short.png sampling.time_limit=0.1 \
        image.width=640 image.height=480 farm.tile=64 sampling.min_samples=65534 sampling.max_samples=65536 &&
        [ "$(lines "$err")" -eq 1 ] && [ "$(cat short.png)" = old ] && ! [ -e short.journal ] &&
        case $err in *"over before any sample was taken"*) ;; *) echo "# $err"; return 1 ;; esac
}
check "a limit that leaves no time" too_short
loading() {
    run 1 farm_n 2 "$SCENE" output.image=short.png sampling.time_limit=0.001 && [ "$(lines "$err")" -eq 1 ] &&
        [ "$(cat short.png)" = old ] && ! [ -e short.journal ] &&
        case $err in
        *"over before any sample was taken"*"scene and picture were in memory after "*) ;;
        *) echo "# $err"; return 1 ;;
        esac
}
check "a limit that is over before the scene is there" loading

# The file of the preview is complete at any time.
preview() {
    farm_n 2 "$SCENE" output.image=so_far.pfm output.report= sampling.time_limit=3 \
        sampling.max_samples=65536 output.preview=0.1 >/dev/null 2>&1 &
    for i in 1 2 3 4 5 6 7 8 9 10; do
        sleep 0.25
        [ -e so_far.pfm ] || continue
        # cp fails if the file is replaced while it is copied.
        cat so_far.pfm >copy.pfm && [ "$(wc -c <copy.pfm)" -eq "$(wc -c <reference.pfm)" ] || return 1
        seen=$((${seen:-0} + 1))
    done
    wait
    [ "${seen:-0}" -gt 0 ]
}
check "previews" preview

# Pixels that are not rendered yet show the pre-pass. With this number of samples a pixel takes a tenth of a second.
early() {
    rm -f early.pfm seen.pfm
    farm_n 2 "$SCENE" output.image=early.pfm output.report= sampling.min_samples=65534 \
        sampling.time_limit=4 sampling.max_samples=65536 output.preview=0.1 >/dev/null 2>&1 &
    for i in 1 2 3 4 5 6 7 8 9 10 11 12; do
        sleep 0.25
        [ ! -e early.pfm ] || cp early.pfm seen.pfm
    done
    wait
    [ "$(tr -d '\000' <seen.pfm | wc -c)" -gt $(($(wc -c <reference.pfm) / 2)) ]
}
check "previews of what is not rendered" early

# foretells GOAL MOST_SAMPLES
foretells() {
    render goal.pfm 0 sampling.target_error=0.003 sampling.max_samples="$2" && echo "$out" &&
        echo "$out" | grep -q "^$1"
}
check "a round goal" foretells "an RMSE of 0.001 would take" 256
check "half of the error where that is beyond" foretells "an RMSE of 0.0013 would take" 128
check "half is beyond, too" foretells "an RMSE of 0.0012 is beyond sampling.max_samples = 64, 128 would be enough" 64

refused() { # TEXT OVERRIDE...
    text=$1; shift
    run 2 farm_n 0 "$SCENE" output.image=no.png "$@" && [ "$(lines "$err")" -eq 1 ] &&
        case $err in *"$text"*) ! [ -e no.png ] ;; *) echo "# $err"; return 1 ;; esac
}
check "a folder as reference" refused ".: is a folder, expected a colour PFM" sampling.samples=4 sampling.reference=.
check "samples beside a target" refused "samples is not used" sampling.target_error=0.1 sampling.samples=4
check "samples beside a limit" refused "samples is not used" sampling.time_limit=1 sampling.samples=4
printf '[sampling]\nsamples = 4\n[sphere a]\ncenter = 0 0 0\nradius = 1\n[light a]\nposition = 0 9 9\n' >both.ini
sed 's/samples = 4/&\ntarget_error = 0.1/' both.ini >twice.ini
beside() {
    run 2 "$FARM" twice.ini && case $err in twice.ini:2:*"samples is not used"*) ;; *) echo "$err"; return 1 ;; esac
    run 0 "$FARM" --print-config both.ini sampling.target_error=0.1 && echo "$out" >again.ini &&
        run 0 "$FARM" --check again.ini && ! grep -q '^samples' again.ini
}
check "an argument takes the place of samples in a file" beside
check "odd min_samples" refused "min_samples is odd" sampling.target_error=0.1 sampling.min_samples=5
check "odd max_samples" refused "max_samples is odd" sampling.target_error=0.1 sampling.max_samples=15
check "no room between them" refused "max_samples is not above" sampling.time_limit=1 \
    sampling.min_samples=16 sampling.max_samples=16
check "no room below what is not set" refused "sampling.min_samples=4096: min_samples is not below" \
    sampling.time_limit=1 sampling.min_samples=4096
check "odd min_samples that is not used" refused "sampling.min_samples=3: min_samples is odd" sampling.min_samples=3
check "odd max_samples that is not used" refused "max_samples is odd" sampling.samples=4 sampling.max_samples=15
check "no room, not used" refused "max_samples is not above" sampling.min_samples=16 sampling.max_samples=8
check "fixed shares" refused "need schedule = dynamic" sampling.time_limit=1 farm.schedule=strips
check "no reference" refused "cannot be opened" sampling.reference=none.pfm
check "a reference of another size" refused "expected a colour PFM" sampling.reference=many.pfm \
    image.width=96
finish
