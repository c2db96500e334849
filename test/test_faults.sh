# A few injected faults of each kind: make bench-faults has hundreds.
. test/lib.sh
# Each kind once, those that kill most often first; small pictures.
faults() {
    ASAN_OPTIONS="verify_asan_link_order=0${ASAN_OPTIONS:+:$ASAN_OPTIONS}" FARM=$FARM FAULTS_SIZE="image.width=112 image.height=112 sampling.samples=16" \
        sh bench/faults.sh 13 3
}
[ -x "${FAULTS_JOURNAL:-}" ] || { echo "ok 1 # SKIP without bench/faults_journal"; exit 0; }
check "13 faults end in 13 identical pictures" faults
finish
