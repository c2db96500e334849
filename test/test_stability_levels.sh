#!/bin/sh
# The catalogue of stiff and extreme cases on every level of the kernel, and with each ray beside copies of
# it, which go through the tree as a packet of 8 or a bundle of 32.
STABILITY=${STABILITY:-build/bench/stability}
status=0

way() { # LEVEL ALIKE RAYS
    if ! "$STABILITY" --kernel "$1" --rows 10 >/dev/null 2>&1; then
        echo "not ok 1 - kernel = $1 # SKIP this processor lacks it"
        return
    fi
    "$STABILITY" --quick --rays "$3" --tap --kernel "$1" --alike "$2" || status=1
}

way portable 1 1500
way avx2 1 1500
way avx2 8 400
way avx2 32 100
way avx512 8 400
way avx512 32 100
exit $status
