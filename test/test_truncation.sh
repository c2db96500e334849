# The errors that pruned pictures claim hold in every pixel: bench-error-truncation with small pictures.
. test/lib.sh
TRUNCATION=${TRUNCATION:-build/bench/error_truncation}
check "the claims hold" "$TRUNCATION" --quick --size 24x18 --csv /dev/null --markdown /dev/null
finish
