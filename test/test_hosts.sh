# Several hosts: network namespaces with host names, addresses and shared memory of their own.
. test/lib.sh

if [ "$(id -u)" -ne 0 ] || ! unshare --net --uts --mount --ipc true 2>/dev/null ||
    ! unshare --net ip link add port type veth peer name other 2>/dev/null; then
    echo "not ok 1 - several hosts # SKIP needs root and network namespaces"
    exit 0
fi

# The exit status is not checked: with MPICH 4.0.2 over TCP, MPI_Finalize sometimes hangs, and mpiexec then complains
# about ranks that have left without it.
hosts() { sh bench/hosts.sh "2 1" config/hello.ini image.width=160 image.height=120 >"$T/hosts" 2>&1; }
hosts
said() { grep -q "$1" "$T/hosts" || { cat "$T/hosts"; return 1; }; }
check "two hosts with different numbers of ranks render the picture of one" said '^the same picture'
check "every host took part" said '^node2: 1 rank,'
refused() {
    for argument in output.image="$T/y.png" output.report="$T/y.json"; do
        run 2 sh bench/hosts.sh "2 1" config/hello.ini image.width=16 "$argument" &&
            [ "$err" = "hosts.sh: $argument: picture and report are thrown away, expected no name for them" ] ||
            return 1
    done
}
check "no names for what is thrown away" refused
finish
