# What pruned pictures claim to be wrong by holds in every pixel: bench-error-truncation, small.
. test/lib.sh
TRUNCATION=${TRUNCATION:-build/bench/error_truncation}
check "the claims hold" "$TRUNCATION" --quick --size 24x18 --csv /dev/null --markdown /dev/null
finish
