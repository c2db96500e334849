#!/bin/sh
# What is left out of a scene changes no picture: each case of bench-omit once, small.
OMIT=${OMIT:-build/bench/omit}
exec "$OMIT" --quick
