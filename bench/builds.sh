#!/bin/sh
# Builds the farm with other compilers and options and compares its pictures, byte by byte, with the instructions that
# the processor has and with those of any one, which the options are about: one line
# "same WHAT" or "differs WHAT" per build, "missing WHAT" where a compiler or what it compiles for is not
# there. Status 1 when something differs or cannot be built.
# From the top folder; builds go to OUT, build/bits/ unless told otherwise. COMPILERS="clang" for one of them.
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
    # MPICH's and Open MPI's compiler wrappers take the compiler from these.
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
        # A processor without fused multiply-add cannot run what is built for it.
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
