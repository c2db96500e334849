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
#             that samples hit only by chance, and of a pattern that is the same in every pixel
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
ALL="allocation sampling large limits truncation formulas forecast coverage fields peers"
SECTIONS=${*:-$ALL}
HERE=$(dirname "$0")
FOLDER=${SCENES:-}
SCENES=${ERROR_SCENES:-lantern garden ground balls}
COVERED=${ERROR_SCENES:-$SCENES specks dust bars}
SIZE=${ERROR_SIZE:-320x240} PEERS_SIZE=${ERROR_PEERS_SIZE:-160x120}
FINEST=${ERROR_FINEST:-16} REPEAT=${ERROR_REPEAT:-3}
MANY=$((64 * FINEST))        # of a reference
LARGE=${ERROR_LARGE:-1920x1440} LARGE_SAMPLES=${ERROR_LARGE_SAMPLES:-lantern=64 garden=64}
LIMITS=${ERROR_LIMITS:-1 2 5 10} LIMITS_SIZE=${ERROR_LIMITS_SIZE:-640x480}
OUT=bench/out
set_size() { W=${1%x*} H=${1#*x}; } # of pictures; a section may change it
set_size "$SIZE"
KEPT=$WORK/references
broken=0 # bounds
mkdir -p "$WORK/peers" "$KEPT" "$OUT"

. "$HERE/report.sh"
for part in rows scenes plots runs; do . "$HERE/error/$part.sh"; done
renew "$KEPT/state" "" "$KEPT"/ref_*.pfm "$KEPT"/ref_*.json "$KEPT"/deep_*.pfm "$KEPT"/deep_*.json \
    "$WORK/balls.ini" "$WORK/specks.ini" "$WORK/dust.ini" "$WORK/bars.ini"

for section in $SECTIONS; do
    case " $ALL " in
    *" $section "*) . "$HERE/error/$section.sh"; "$section"; cat "$OUT/error_$section.md"; set_size "$SIZE" ;;
    *) echo "error.sh: there is no section $section" >&2; exit 2 ;;
    esac
done
[ "$broken" -eq 0 ] || { echo "error.sh: bounds of truncation that do not hold: $broken" >&2; exit 1; }
