# The errors of large pictures, by some of their pixels.

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
