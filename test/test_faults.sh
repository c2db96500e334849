# Injects a few faults of each kind (make bench-faults has hundreds), and tests whether that bench notices errors.
. test/lib.sh
# The farm must read as many records as a program counts that shares no code with it.
read_all() {
    awk -F, 'NR > 1 && $7 != $8 { print "run " $1 ": " $7 " records, read " $8; bad = 1 } END { exit bad }' \
        "$T/faults.csv"
}
# Most faults must hit a process, also those that need a journal with tiles, and some journal must have many tiles.
met() {
    awk -F, 'NR > 1 { runs++; hits += $12 == "yes" }
        $12 == "yes" { hit[$2] = 1; records[$2] += $7; most = $7 > most ? $7 : most }
        END { exit hits < 0.7 * runs || !hit["stop"] || !hit["torn"] || !records["rank"] ||
                   !records["flipped"] || most < 10 }' "$T/faults.csv"
}
# Each kind once, those that most often kill a process first. On a busy machine some runs end before their fault is
# injected; then other runs are tried.
faults() {
    for seed in 3 4; do
        ASAN_OPTIONS="verify_asan_link_order=0${ASAN_OPTIONS:+:$ASAN_OPTIONS}" FARM=$FARM FAULTS_SECONDS=2 \
            FAULTS_UNTIL=0.6 FAULTS_PATIENCE=3 \
            sh bench/faults.sh 13 $seed "$T" || return 1
        cat "$T/faults.csv"
        read_all || return 1
        met && return 0
    done
    return 1
}
[ -x "${FAULTS_JOURNAL:-}" ] || { echo "not ok 1 - injected faults # SKIP without bench/faults_journal"; exit 0; }
check "13 faults end in 13 identical pictures" faults

# A fake farm that does one thing wrong, and a fake mpiexec that starts one process.
cat >"$T/mpiexec" <<'EOF'
#!/bin/sh
shift 2
exec "$@"
EOF
cat >"$T/farm" <<'EOF'
#!/bin/sh
for a in "$@"; do case $a in output.image=*) image=${a#*=} ;; esac; done
[ "$image" = ref.pfm ] || case $WRONG in
picture) echo other >"$image"; exit 0 ;;
process) sleep 60 >/dev/null 2>&1 & ;;
segment) echo >"/dev/shm/farm-test-$$" ;;
status) echo same >"$image"; exit 9 ;;
hang) sleep 60 ;;
esac
echo same >"$image"
EOF
chmod +x "$T/mpiexec" "$T/farm"

# notices WRONG COLUMN-OF-THE-TABLE: a run without a fault must fail, with a 1 in that column and in no other.
notices() {
    WRONG=$1 MPIEXEC=$T/mpiexec FARM=$T/farm FAULTS_KINDS=none FAULTS_LIMIT=2 FAULTS_LEFT=1 \
        sh bench/faults.sh 1 1 >"$T/table" 2>&1
    status=$?
    rm -f /dev/shm/farm-test-*
    cat "$T/table"
    [ $status -eq 1 ] || return 1
    awk -F'|' -v column="$2" '/^. [0-9]/ { rows++; for (i = 5; i <= 11; i++) if ($i + 0 != (i == column)) bad = 1 }
        END { exit bad || !rows }' "$T/table"
}
check "the bench sees a picture that differs" notices picture 6
check "the bench sees a process that is left" notices process 8
check "the bench sees a segment that is left" notices segment 9
check "the bench sees another status" notices status 11
hung() { notices hang 7; [ "$(awk -F'|' '/^. [0-9]/ { print $7 + 0; exit }' "$T/table")" -ge 1 ]; }
check "the bench sees a hang" hung
nothing() { WRONG='' MPIEXEC=$T/mpiexec FARM=$T/farm FAULTS_KINDS=none sh bench/faults.sh 1 1; }
check "and sees nothing where nothing is wrong" nothing
# Runs that end at once, or that have no rank 0.
missed() {
    WRONG='' MPIEXEC=$T/mpiexec FARM=$T/farm FAULTS_KINDS="master mpiexec stop moment" \
        sh bench/faults.sh 4 1 >"$T/table" 2>&1
    cat "$T/table"
    grep -q '^| 4 | 0 | 4 |' "$T/table"
}
check "a fault that nobody got is not counted as injected" missed
finish
