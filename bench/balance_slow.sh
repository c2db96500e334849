# balance_slow.sh PROGRAM ARGUMENT...: runs the program beside three processes that use all the CPU time they get. They
# end with this script, however it ends.
spinners= program=
# SIGKILL, as a loop that has just been started might miss another signal.
trap '{ kill -KILL $spinners; kill $program; } 2>/dev/null' EXIT
trap 'exit 1' INT TERM
for i in 1 2 3; do
    setpriv --pdeathsig KILL sh -c 'while :; do :; done' & spinners="$spinners $!"
done
# In the background, as a shell handles a signal only when the command in the foreground has ended.
"$@" & program=$!
wait $program
status=$?
program=
exit $status
