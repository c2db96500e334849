# PROGRAM ARGUMENT...: runs it beside three processes that use all of the core they get. They end with this one,
# however it ends.
spinners= program=
# A loop that has hardly begun might take no notice of anything less.
trap '{ kill -KILL $spinners; kill $program; } 2>/dev/null' EXIT
trap 'exit 1' INT TERM
for i in 1 2 3; do
    setpriv --pdeathsig KILL sh -c 'while :; do :; done' & spinners="$spinners $!"
done
# In the background: of a signal a shell takes no notice before what runs in the foreground has ended.
"$@" & program=$!
wait $program
status=$?
program=
exit $status
