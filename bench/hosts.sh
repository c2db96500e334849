#!/bin/sh
# The farm on several hosts, which are network namespaces of this machine: each with a host name, a
# network address and shared memory of its own, joined by veth pairs and a bridge. mpiexec starts
# its proxies through a launcher that enters them, as ssh would. Needs root.
#
#   sh bench/hosts.sh "2 3 1" config/garden.ini [SECTION.KEY=VALUE ...]
#
# renders on hosts with 2, 3 and 1 ranks, and prints which ranks took part, how many bytes each host received over the
# network, and whether the picture is that of a single process. Leaves no files, not even picture and report.
set -u
export LC_ALL=C
ranks=$1 scene=$2; shift 2
for argument; do
    case $argument in output.image=* | output.report=*)
        echo "hosts.sh: $argument: picture and report are thrown away, expected no name for them" >&2
        exit 2
    esac
done
FARM=$(realpath "${FARM:-./farm}")
MPIEXEC=${MPIEXEC:-mpiexec}
T=$(mktemp -d)
pids=

clean_up() {
    for pid in $pids; do kill "$pid" 2>/dev/null; done
    rm -rf "$T"
}
trap clean_up EXIT
trap 'exit 1' INT TERM

# hold NAME: makes namespaces, which exist as long as a sleeping process in them.
hold() {
    unshare --net --uts --mount --ipc sh -c "echo \$\$ >'$T/$1.pid'; exec sleep 600" </dev/null >/dev/null 2>&1 &
    pids="$pids $!"
    until [ -s "$T/$1.pid" ]; do
        kill -0 $! 2>/dev/null || { echo "hosts.sh: no namespaces can be made here, which needs root" >&2; exit 1; }
        sleep 0.05
    done
}
enter() { name=$1; shift; nsenter -t "$(cat "$T/$name.pid")" -n -u -m -i "$@"; }

hold switch
enter switch sh -c 'ip link add br0 type bridge && ip link set br0 up' || exit 1
echo '127.0.0.1 localhost' >"$T/hosts"
total=0 n=0
for count in $ranks; do
    n=$((n + 1)) total=$((total + count))
    echo "10.77.0.$n node$n" >>"$T/hosts"
    echo "node$n:$count" >>"$T/hostfile"
    hold node$n
    enter switch ip link add port$n type veth peer name eth0 netns "$(cat "$T/node$n.pid")" &&
        enter switch ip link set port$n master br0 up &&
        enter node$n sh -c "hostname node$n && ip link set lo up && ip link set eth0 up &&
            ip addr add 10.77.0.$n/24 dev eth0 && mount -t tmpfs tmpfs /dev/shm &&
            mount --bind '$T/hosts' /etc/hosts" || exit 1
done

# A launcher that is called like ssh: options, host, command.
cat >"$T/launch" <<EOF
#!/bin/sh
while [ "\${1#-}" != "\$1" ]; do shift; done
host=\$1; shift
exec nsenter -t "\$(cat "$T/\$host.pid")" -n -u -m -i sh -c "\$*"
EOF
chmod +x "$T/launch"

# Quotes a word for a shell.
quoted() { printf "'"; printf %s "$1" | sed "s/'/'\\\\''/g"; printf "' "; }
received() { enter "node$1" awk '/eth0:/ { sub(/.*:/, ""); print $1 }' /proc/net/dev; }
for i in $(seq $n); do received "$i" >"$T/before$i"; done
"$FARM" "$scene" output.image="$T/one.pfm" output.report= "$@" >/dev/null 2>&1 || exit 1
# The command is a script, so that arguments with blanks are passed on unchanged.
{
    printf 'cd %s && %s' "$(quoted "$PWD")" "timeout 60 $MPIEXEC -launcher ssh -n $total "
    for word in -launcher-exec "$T/launch" -f "$T/hostfile" "$FARM" "$scene" \
        "output.image=$T/many.pfm" "$@"; do quoted "$word"; done
    echo
} >"$T/command"
enter node1 sh "$T/command" >"$T/log" 2>&1
status=$?
echo "exit status $status"
for i in $(seq $n); do
    took=$(grep -cs "\"host\": \"node$i\"" "$T/many.json") plural=s
    took=${took:-0} # the run wrote no report
    [ "$took" -ne 1 ] || plural=
    echo "node$i: $took rank$plural, $(($(received "$i") - $(cat "$T/before$i"))) bytes received"
done
sed -n 's/^ *"bytes": \([0-9]*\),$/scene: \1 bytes/p' "$T/many.json" | head -1
if cmp -s "$T/one.pfm" "$T/many.pfm"; then echo "the same picture as on one host"
else echo "ANOTHER PICTURE than on one host"; status=1; fi
exit $status
