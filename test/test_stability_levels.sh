#!/bin/sh
# The catalogue of stiff and extreme cases on every level of the kernel; also with 8 or 32 copies of each ray, which
# form a packet or a bundle and must give the bits that one more copy, traced alone, gives.
STABILITY=${STABILITY:-build/bench/stability}
status=0

way() { # LEVEL ALIKE RAYS
    why=$("$STABILITY" --kernel "$1" --rows 10 2>&1)
    if [ $? -eq 2 ] && echo "$why" | grep -q "this processor lacks" && [ "$1" != portable ]; then
        echo "not ok 1 - kernel = $1 # SKIP this processor lacks it"
        return
    fi
    "$STABILITY" --quick --rays "$3" --tap --kernel "$1" --alike "$2" || status=1
}

way portable 1 1500
way avx2 1 1500
way avx2 9 400
way avx2 33 100
way avx512 9 400
way avx512 33 100
exit $status
