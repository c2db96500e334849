#!/bin/sh
# Leaving out what a scene does not need changes no picture: each case of bench-omit once, small.
OMIT=${OMIT:-build/bench/omit}
exec "$OMIT" --quick
