# What the best allocation of samples to pixels could gain over equal numbers for all pixels.

allocation() {
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
    } >"$OUT/error_allocation.md"
}
