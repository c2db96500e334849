#!/bin/sh
# The catalogue of stiff and extreme cases with few samples each: one "ok" or "not ok" per row.
STABILITY=${STABILITY:-build/bench/stability}
exec "$STABILITY" --quick --tap
