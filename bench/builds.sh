#!/bin/sh
# Builds the farm with other compilers and options, and compares its pictures byte by byte: with the kernel of the
# highest level that the processor supports and with the portable one, on which the options have an effect. Prints one
# line per build: "same WHAT", "differs WHAT", or "missing WHAT" if there is no such compiler or processor. Status 1 if
# something differs or cannot be built. To be run from the top folder. Builds go to OUT (build/bits/). COMPILERS="clang"
# selects compilers.
set -u
export LC_ALL=C
SCENES="test/data/everything.ini config/extreme/ground.ini config/extreme/shells.ini"
SIZE="image.width=120 image.height=90 sampling.samples=2"
KERNELS="auto portable"
OUT=${OUT:-build/bits}
status=0
mkdir -p "$OUT"

render() { # FARM NAME
    for scene in $SCENES; do
        for kernel in $KERNELS; do
            "$1" "$scene" output.report= output.image="$OUT/$2-$kernel-$(basename "$scene" .ini).pfm" $SIZE \
                farm.kernel=$kernel >/dev/null 2>"$OUT/$2.log" || return 1
        done
    done
}

build() { # NAME COMPILER OPTIONS
    dir=$OUT/$1
    # These variables tell MPICH's and Open MPI's compiler wrappers the compiler.
    MPICH_CC=$2 OMPI_CC=$2 make -s -j2 BUILD="$dir" FARM="$dir/farm" OPTIMISE="$3" "$dir/farm" \
        >"$OUT/$1.log" 2>&1 && render "$dir/farm" "$1"
}

compare() { # NAME
    for scene in $SCENES; do
        base=$(basename "$scene" .ini)
        for kernel in $KERNELS; do
            cmp -s "$OUT/reference-auto-$base.pfm" "$OUT/$1-$kernel-$base.pfm" || return 1
        done
    done
}

build reference gcc "-O2" || { echo "differs reference: cannot be built"; exit 1; }
for compiler in ${COMPILERS:-gcc clang}; do
    command -v "$compiler" >/dev/null || { echo "missing $compiler"; continue; }
    for options in "-O0" "-O1" "-O3" "-O3 -mfma" "-O3 -march=native" "-O2 -mno-fma -mno-avx"; do
        # A processor without fused multiply-add cannot run such a build.
        case $options in
        *-mfma*) grep -q -w fma /proc/cpuinfo || { echo "missing fma of $compiler"; continue; } ;;
        esac
        name=$(echo "$compiler$options" | tr -d ' =')
        if ! build "$name" "$compiler" "$options"; then
            echo "differs $compiler $options: cannot be built or run"
            status=1
        elif compare "$name"; then
            echo "same $compiler $options"
        else
            echo "differs $compiler $options"
            status=1
        fi
    done
done
exit $status
