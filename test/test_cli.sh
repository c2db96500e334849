# The command line, and errors in the input: each gives one clear line and exit status 2, and nothing is started.
. test/lib.sh
cd "$T" || exit 1
cp "$DATA"/everything.ini "$DATA"/star.* "$DATA"/parts.nff .

help() { run 0 "$FARM" --help && echo "$out" | grep -q 'usage:' && [ -z "$err" ]; }
check "--help on stdout" help
version() {
    run 0 "$FARM" --version && echo "$out" | head -n 1 | grep -Eqx 'farm [0-9]+\.[0-9]+\.[0-9]+' &&
        echo "$out" | sed -n 2p | grep -q '^MPI: .*[0-9]' &&
        echo "$out" | sed -n 3p | grep -Eqx 'kernel: (portable|avx2|avx512)' && [ "$(echo "$out" | wc -l)" -eq 3 ]
}
check "--version on stdout" version
once() { run 0 farm_n 3 --help && [ "$(echo "$out" | grep -c usage:)" -eq 1 ]; }
check "--help under mpiexec is said once" once

# Another build: the same program, with the checksum of its sources changed.
build=$(LC_ALL=C grep -ao "$("$FARM" --version | head -n 1 | cut -d' ' -f2)-[0-9][0-9]*" "$FARM" | head -n 1)
digit=${build#"${build%?}"}
LC_ALL=C sed "s/$build/${build%?}$(((digit + 1) % 10))/g" "$FARM" >"$T/other"
chmod +x "$T/other"
together() { timeout 60 "$MPIEXEC" -n 1 "$FARM" "$CONFIG/hello.ini" output.image="$T/h.png" : -n 1 "$1" x; }
builds() {
    together "$FARM" && run 1 together "$T/other" &&
        echo "$err" | grep -q '^farm: rank 1: this is farm .*, but rank 0 runs another build$'
}
check "ranks of two builds do not render together" builds
task() { # of Slurm, but no rank
    run 0 env -u PMI_RANK SLURM_PROCID=3 "$FARM" --version && [ "$out" ] &&
        run 2 env -u PMI_RANK SLURM_PROCID=3 "$FARM" --frobnicate x.ini && echo "$err" | grep -q frobnicate &&
        run 2 env PMI_RANK=1 "$FARM" --frobnicate x.ini && echo "$err" | grep -q frobnicate # left over
}
check "a farm in a Slurm task of its own speaks" task
alone() { # SIZE MESSAGES: among so many processes of a launcher that MPICH does not know
    OMPI_COMM_WORLD_SIZE=$1 run 0 "$FARM" "$CONFIG/hello.ini" output.image="$T/h.png" image.width=8 image.height=8
    [ "$(echo "$err" | grep -c "OMPI_COMM_WORLD_SIZE is $1, but each of these processes is alone")" -eq "$2" ]
}
check "a launcher of another MPI" alone 4 1
check "which started one process" alone 1 0
asked_for() { # one process of MPICH's own launcher, which another launcher has started
    run 0 env SLURM_STEP_NUM_TASKS=4 "$MPIEXEC" -n 1 "$FARM" "$CONFIG/hello.ini" output.image="$T/h.png" \
        image.width=8 image.height=8 && [ -z "$err" ]
}
check "one process that was asked for is no surprise" asked_for
harmless() { # names of files write nothing else to the terminal
    name=$(printf 'a\033]0;b\007\302\233\351c\303\251') shown='a?]0;b????cé'
    run 0 farm_n 0 everything.ini image.width=8 image.height=6 "output.image=$name.png" \
        "output.report=$name.json" && echo "$out" | grep -qF "picture $shown.png" &&
        echo "$out" | grep -qF "report  $shown.json" && rm "$name.png" "$name.json"
}
check "control characters in names" harmless

short_help() { run 0 "$FARM" -h && echo "$out" | grep -q '^  --help, -h  '; }
check "-h is --help, which tells so" short_help
narrow_help() { # the words do not depend on the width
    "$FARM" --help >whole && awk 'length > 80 { exit 1 }' whole || return 1
    for columns in 60 64 200; do
        script -qec "stty cols $columns; '$FARM' --help" /dev/null | tr -d '\r' >wrapped
        sed '/^examples/,$d' wrapped | awk "length > $columns { exit 1 }" || return 1
        [ "$(tr -s ' \n' ' ' <wrapped)" = "$(tr -s ' \n' ' ' <whole)" ] || return 1
    done
    [ "$(wc -l <wrapped)" -lt "$(wc -l <whole)" ]
}
check "--help on a narrow and on a wide terminal" narrow_help
# The width of a terminal is that of what goes there, not of a table that mpiexec writes to a file.
narrow_table() {
    on_narrow() { script -qec "stty cols 50; '$MPIEXEC' -n 2 '$FARM' '$CONFIG/hello.ini' $1" /dev/null | tr -d '\r'; }
    on_narrow 'output.image=h.png 2>notes' >wrapped && on_narrow 'output.image=h.png >whole' || return 1
    awk 'length > 50 { exit 1 }' wrapped && awk 'length > 50 { wide = 1 } END { exit !wide }' whole
}
check "the table on a narrow terminal, and in a file" narrow_table
first_line() { # COMMAND: the longest line with the version that it writes to a terminal of 50 columns
    script -qec "stty cols 50; TERM=xterm $1" /dev/null | tr '\r' '\n' | sed "s/.*$(printf '\033')\[K//" |
        awk '/^farm [0-9]/ { print length }'
}
launched() { # the launcher's terminal is found at the other end of its pipes, unless the table goes elsewhere
    job="$FARM everything.ini image.width=8 image.height=6 output.journal= output.report="
    wide=$(first_line "$job >o; cat o") narrow=$(first_line "$job")
    behind=$(first_line "$MPIEXEC -n 1 $job") apart=$(first_line "$MPIEXEC -n 1 sh -c 'exec $job >o'; cat o")
    unset=$(first_line "$MPIEXEC -n 1 env -u PMI_RANK -u PMI_FD -u PMI_PORT $job")
    rm everything.png o
    echo "$wide $narrow $behind $apart $unset"
    [ "$wide" -gt 50 ] && [ "$narrow" -le 50 ] && [ "$behind" -le 50 ] && [ "$apart" -gt 50 ] && [ "$unset" -gt 50 ]
}
check "the launcher's terminal" launched

wrong() { # N PATTERN ARGUMENT...: one line on stderr that matches, status 2, nothing left behind
    n=$1 pattern=$2; shift 2
    before=$(ls)
    run 2 farm_n "$n" "$@" || return 1
    echo "$err"
    [ "$(lines "$err")" -eq 1 ] && [ -z "$out" ] && [ "$(ls)" = "$before" ] &&
        echo "$err" | grep -Eq "$pattern"
}
values() { # what looks like a setting is taken for no scene
    wrong 0 "'image.width' has no value, expected image.width=VALUE" everything.ini image.width &&
        wrong 0 "'image.width' has no value" image.width everything.ini &&
        wrong 0 "expected sphere a.radius=VALUE" everything.ini "sphere a.radius" &&
        wrong 0 "did you mean 'image.width=30'" everything.ini width=30 &&
        wrong 0 "'foo=30' is neither" everything.ini foo=30 &&
        wrong 0 "'light' is a second scene.*quotes" everything.ini light key.color=1 1 1 &&
        wrong 0 "'0' is a second scene.*quotes" everything.ini image.region=0 0 5 5 &&
        wrong 0 "unknown option '-1', settings with spaces need quotes" everything.ini camera.eye=0 -1 5
}
check "settings in pieces" values
for scene in sphere.obj camera.ini box.nff; do # which is not there, and begins like a setting
    check "$scene is missing" wrong 0 "^$scene: cannot be opened" "$scene"
    check "$scene is missing, --check" wrong 0 "^$scene: cannot be opened" --check "$scene"
done
dots() { # and '=' in a path are no override
    mkdir -p a.5/b=0.5 && cp everything.ini star.* parts.nff a.5/b=0.5/ && cp everything.ini v1.2=3.ini || return 1
    for scene in "a.5/b=0.5/everything.ini" "./a.5/b=0.5/everything.ini" "$T/a.5/b=0.5/parts.nff" v1.2=3.ini; do
        run 0 farm_n 0 --check "$scene" image.width=20 && echo "$out" | grep -q ' 20 x ' || return 1
    done
    wrong 0 '^./a.5/b=0.5/none.ini: cannot be opened' ./a.5/b=0.5/none.ini &&
        wrong 0 'unknown section' everything.ini mseh.file=star.obj
}
check "paths with a dot before a =" dots
idle() { # MESSAGES ARGUMENT...
    messages=$1; shift
    run 0 "$FARM" --check everything.ini "$@" && echo "$err" &&
        [ "$(echo "$err" | grep -c 'samples of \[sampling\] is not used')" -eq "$messages" ]
}
large_target() { # MESSAGES ERROR
    run 0 "$FARM" --check everything.ini sampling.target_error="$2" &&
        [ "$(printf '%s\n' "$err" | grep -c '1 is white')" -eq "$1" ]
}
check "min_samples and max_samples without a use" idle 2 sampling.min_samples=8 sampling.max_samples=16
check "switched off for once" idle 0 sampling.min_samples=8 sampling.time_limit=0
check "an error that hardly any picture has" large_target 1 5
check "one that some have" large_target 0 0.5
check "with a use" idle 0 sampling.min_samples=8 sampling.time_limit=1
unmade() { # that a folder exists where no file can be made is known
    wrong 0 '^/proc/x.png: the folder cannot be written to' everything.ini output.image=/proc/x.png
}
check "a folder without files of ours" unmade
removed() { # the folder that a run is started in
    mkdir gone && (cd gone && rmdir ../gone && "$FARM" "$T/everything.ini" 2>"$T/err"; [ $? -eq 2 ]) &&
        grep -qx 'everything.png: its folder has been removed, choose another place with output.image=FILE' "$T/err"
}
check "the true reason where the current folder has been removed" removed
for n in 0 2; do
    check "no arguments, -n $n" wrong $n 'no scene given'
    check "unknown option, -n $n" wrong $n "unknown option '--frobnicate', expected one of -h .*, or -- " \
        --frobnicate everything.ini
    check "the number of processes, -n $n" wrong $n 'expected mpiexec in front of it' -n 4 everything.ini
    check "two scenes, -n $n" wrong $n 'second scene' everything.ini everything.ini
    check "missing file, -n $n" wrong $n '^nothing\.ini: ' nothing.ini
    check "a folder, -n $n" wrong $n '^\.: ' .
    check "unknown extension, -n $n" wrong $n 'expected' lib.txt
    check "unknown key in an override, -n $n" wrong $n "image.widht.*width" everything.ini image.widht=3
    check "zero-sized picture, -n $n" wrong $n 'image.width' everything.ini image.width=0
    check "not a number, -n $n" wrong $n 'image.width' everything.ini image.width=many
    check "missing output folder, -n $n" wrong $n 'output.image' everything.ini \
        output.image=missing/folder/a.png
    check "unknown picture format, -n $n" wrong $n 'png' everything.ini output.image=a.jpeg
    check "a report that is no .json, -n $n" wrong $n 'report has an unknown extension, expected .json' everything.ini \
        output.report=everything.ini
done
meant() { # ARGUMENT MEANT
    check "what $1 means" wrong 0 "^farm: .*'$1'.*, did you mean '$2'[?]\$" everything.ini "$1"
}
meant --versoin --version
meant -check --check
meant --samples sampling.samples=VALUE
meant --max-depth=3 render.max_depth=3
meant max-depth=3 render.max_depth=3
meant -o output.image=FILE
meant image=a.png output.image=a.png
meant a.png output.image=a.png
check "a section without a key" wrong 0 "^farm: 'output=a.png' names no key, expected output.KEY=VALUE" \
    everything.ini output=a.png
check "spaces beside =" wrong 0 "'sampling.samples' has no value, .* without spaces beside '='" \
    everything.ini sampling.samples = 4
to_stdout() { # KEY: into a file, too, where the table does not write over it
    "$FARM" everything.ini image.width=8 image.height=6 sampling.samples=2 \
        output.image=table.png "output.$1=/dev/stdout" >table && grep -q "$2" table &&
        grep -q 'Wall time of rank 0' table
}
check "the report on stdout" to_stdout report '"version"'
check "the rows of error on stdout" to_stdout error 'elapsed_s,'
to_stream() { # KEY PATH REDIRECTED WHAT: appended to the file that the descriptor is redirected to
    echo "previous log" >log
    eval "\"\$FARM\" everything.ini image.width=8 image.height=6 sampling.samples=2 output.image=table.png \
        output.report= output.$1=$2 $3>>log >table" || return 1
    cat log && grep -q "$4" log && [ "$(head -n 1 log)" = "previous log" ]
}
ln -s /dev/stderr stderr.json && ln -s stderr.json stream.json
check "the report behind links to stderr" to_stream report stream.json 2 '"version"'
check "the rows of error on stderr, which is a file" to_stream error /dev/stderr 2 'elapsed_s,'
check "the rows of error on a descriptor, which is a file" to_stream error /dev/fd/3 3 'elapsed_s,'
link_to_stdout() { # with the table behind it
    echo "previous log" >log && ln -sf /dev/stdout so.json
    "$FARM" everything.ini image.width=8 image.height=6 sampling.samples=2 output.image=table.png \
        output.report=so.json >>log || return 1
    cat log && [ "$(head -n 1 log)" = "previous log" ] && grep -q '"version"' log &&
        grep -q 'Wall time of rank 0' log && [ -h so.json ]
}
check "the report behind a link to stdout" link_to_stdout
twice() { # the trace would replace the file that the report is in
    "$FARM" everything.ini output.report=/dev/stdout output.trace=twice.json >twice.json 2>"$T/err"
    status=$?
    cat "$T/err" && rm twice.json && [ $status -eq 2 ] && grep -q 'trace is also the name of the report' "$T/err"
}
check "one file for two outputs, one of them by way of stdout" twice
check "no file for writing is open at a descriptor" wrong 0 '^/dev/fd/77: cannot write: Bad file descriptor' \
    everything.ini output.report=/dev/fd/77
print_stdout() {
    run 0 "$FARM" --print-config everything.ini output.report=/dev/stdout &&
        echo "$out" | grep -q '^report = /dev/stdout$'
}
check "--print-config keeps /dev/stdout" print_stdout
check "an empty name of a scene" wrong 0 'no scene given' ''
check "rows of error are .csv" wrong 0 'error has an unknown extension, expected .csv' everything.ini \
    output.error=everything.ini
check "an extension alone is no name" wrong 0 '^output.image=.png: image has' everything.ini \
    output.image=.png
over_reference() { # KEY: no output takes the reference's place, however it is written
    head -c 500 "$FARM" >many.pfm
    wrong 0 "^output.$1=./many.pfm: $1 is also the name of the reference" everything.ini \
        sampling.reference=many.pfm "output.$1=./many.pfm" && [ "$(wc -c <many.pfm)" -eq 500 ]
}
late_reference() { # the argument is what is wrong, not the file
    cp everything.ini named.ini && printf '[output]\nimage = other.pfm\n' >>named.ini
    wrong 0 '^sampling.reference=other.pfm: reference is also the name of the image' named.ini \
        sampling.reference=other.pfm
}
check "no reference over the picture" late_reference
check "no picture over the reference" over_reference image
check "no heat map over the reference" over_reference heatmap
check "no output over another that is not there yet" wrong 0 \
    '^output.heatmap=./new.png: heatmap is also the name of the image' everything.ini \
    output.image=new.png output.heatmap=./new.png
linked() { # to a file that is not there yet, and by way of a second link
    ln -s ahead.png behind.png && ln -s "$T/behind.png" last.png &&
        wrong 0 '^output.heatmap=ahead.png: heatmap is also the name of the image' everything.ini \
            output.image=behind.png output.heatmap=ahead.png &&
        wrong 0 '^output.heatmap=last.png: heatmap is also the name of the image' everything.ini \
            output.image=behind.png output.heatmap=last.png
}
check "no output over another behind a link" linked
spared() { # FILE KEY.EXTENSION: no output takes the place of what the scene is read from
    ln -sf "$1" "over.${2#*.}" && cp "$1" kept || return 1
    for check in '' --check; do
        wrong 0 "^output.${2%.*}=over.${2#*.}: ${2%.*} = over.${2#*.} leads to (./)?$1, which the scene is read from" \
            $check everything.ini "output.${2%.*}=over.${2#*.}" && cmp "$1" kept || return 1
    done
}
for key in image.png report.json journal.journal error.csv trace.json heatmap.hdr ranks.png; do
    check "no output.${key%.*} over CONFIG behind a link" spared everything.ini $key
done
for file in parts.nff star.obj star.mtl; do
    check "nor over $file" spared $file image.png
done
derived() { # names that nobody has given, an included INI file, and a second name of the same file
    printf '[sphere a]\ncenter = 0 0 0\nradius = 1\n' >inner.ini && ln -s star.mtl star.json &&
        printf '[include a]\nfile = inner.ini\n' >outer.ini && ln -s inner.ini outer.json && ln inner.ini hard.png &&
        wrong 2 '^outer.ini: report = outer.json leads to inner.ini, which the scene is read from' outer.ini &&
        wrong 0 '^output.image=hard.png: image = hard.png leads to inner.ini' outer.ini \
            output.image=hard.png output.report= &&
        wrong 0 '^star.obj: report = star.json leads to star.mtl' star.obj output.image=star.png &&
        rm star.json
}
check "no output of a name by default over what is read" derived
check "a setting without its section" wrong 0 "did you mean 'sampling.samples=4'" \
    everything.ini samples=4
for key in report error trace heatmap ranks; do
    case $key in report | trace) end=json ;; error) end=csv ;; *) end=png ;; esac
    check "--check tries output.$key, too" wrong 0 "output.$key" --check everything.ini \
        output.$key=missing/folder/a.$end
done
journal() { # what a run refuses --check does, too, with the same word
    ln -s missing.journal link.journal && mkdir folder.journal && ln -sf /dev/null null.journal || return 1
    wrong 0 '^/nonexistent/a.journal: the folder /nonexistent/ does not exist.*output.journal=FILE' \
        --check everything.ini output.journal=/nonexistent/a.journal || return 1
    for place in link.journal folder.journal null.journal /dev/null; do
        said="^$place: is no regular file, choose another place"
        [ $place = folder.journal ] && said="^$place: is a folder, expected a file name in output.journal=FILE"
        wrong 0 "$said" --check everything.ini output.journal=$place &&
            wrong 0 "$said" everything.ini output.journal=$place || return 1
    done
    echo old >old.journal
    run 0 "$FARM" --check everything.ini output.journal=old.journal && [ "$(cat old.journal)" = old ]
}
check "--check tries the journal, too" journal
closed() ( # root, who may write anywhere, takes another user's rights
    mkdir closed && cp everything.ini star.* parts.nff "$FARM" closed && chmod 755 "$T" && chmod 555 closed &&
        cd closed ||
        return 1
    if [ "$(id -u)" -eq 0 ]; then set -- setpriv --reuid=65534 --regid=65534 --clear-groups; fi
    run 0 "$@" "./${FARM##*/}" --check everything.ini output.ranks=ranks.png && [ "$(lines "$err")" -eq 1 ] &&
        echo "$err" | grep -q '^everything.png: warning: the folder cannot be written to (' &&
        echo "$out" | grep -q 'all right' && run 2 "$@" "./${FARM##*/}" everything.ini &&
        echo "$err" | grep -q '^everything.png: the folder cannot be written to (' && [ "$(lines "$err")" -eq 1 ]
)
check "which only warns of a folder that this user may not write to" closed
rm -rf closed
check "nobody would render" wrong 1 'master_renders' everything.ini farm.master_renders=no
check "which --check alone does not mind" run 0 "$FARM" --check everything.ini farm.master_renders=no
check "a region as an argument, which is not repeated" wrong 0 \
    '^image.region=600 0 100 100: the region reaches out of the picture, expected a part of 640 x 480 pixels$' \
    everything.ini image.width=640 image.height=480 'image.region=600 0 100 100'
check "too many tiles" wrong 0 'farm.tile' everything.ini farm.tile=1 image.width=16000 \
    image.height=16000

# bad LINE PATTERN INI-LINES: the error must name the file and that line, and match the pattern.
bad() {
    printf '%b' "$3" >bad.ini
    wrong 0 "^bad\.ini:$1: $2" bad.ini
}
check "unknown key" bad 3 "unknown key.*radus.*radius" '[sphere a]\ncenter = 0 0 0\nradus = 1\n'
check "a comment behind a value" bad 2 ".*begins with ' ;'" '[sphere a]\nradius = 1 # one\ncenter = 0 0 0\n'
check "a comment behind a tab" bad 2 ".*begins with ' ;'" '[sphere a]\nradius = 1\t# one\ncenter = 0 0 0\n'
check "a comment without a blank before it" bad 2 ".*begins with ' ;'" \
    '[sphere a]\nradius = 1; one\ncenter = 0 0 0\n'
check "unknown section" bad 1 "unknown section.*spher.*sphere" '[spher a]\nradius = 1\n'
check "missing key" bad 1 ".*radius" '[sphere a]\ncenter = 0 0 0\n'
check "negative radius" bad 3 ".*radius" '[sphere a]\ncenter = 0 0 0\nradius = -1\n'
check "NaN" bad 2 ".*center" '[sphere a]\ncenter = 0 nan 0\nradius = 1\n'
check "infinity" bad 2 ".*center" '[sphere a]\ncenter = 0 inf 0\nradius = 1\n'
check "overflow" bad 2 ".*center" '[sphere a]\ncenter = 0 1e999 0\nradius = 1\n'
check "two numbers where three are due" bad 2 ".*center" '[sphere a]\ncenter = 0 1\nradius = 1\n'
check "missing material" bad 4 ".*gold.*glod" \
    '[sphere a]\ncenter = 0 0 0\nradius = 1\nmaterial = gold\n[material glod]\n'
check "degenerate camera" bad '[0-9]' ".*look_at" '[camera]\neye = 1 1 1\nlook_at = 1 1 1\n'
check "up along the view" bad '[0-9]' ".*up" '[camera]\neye = 0 0 0\nlook_at = 0 5 0\nup = 0 1 0\n'
check "missing mesh file" bad 2 ".*none.obj" '[mesh a]\nfile = none.obj\n'
check "indented key is a key, not a continuation" bad 3 ".*radus" \
    '[sphere a]\n  center = 0 0 0\n  radus = 1\n'
long=$(printf '%0300d' 0)
check "a long line" bad 2 ".*" "[sphere a]\ncenter = $long\n"
check "a long name" bad 1 ".*" "[sphere $(printf '%060d' 0)]\nradius = 1\n"
check "no closing bracket" bad 1 ".*" '[sphere a\nradius = 1\n'
check "duplicate key" bad 3 ".*radius" '[sphere a]\nradius = 1\nradius = 2\n'

for pair in '--check --print-config' '--print-config --check'; do
    check "$pair" wrong 0 '^farm: --check and --print-config at once' $pair everything.ini
done
dashes() { # end the options
    cp everything.ini ./-v.ini && run 0 "$FARM" --check -- -v.ini image.width=20 &&
        echo "$out" | grep -q ' 20 x ' &&
        wrong 0 "unknown option '-v.ini', expected ./ in front of a file's name: ./-v.ini" --check -v.ini &&
        wrong 0 "'-v.ini' is a second scene" -- everything.ini -v.ini && rm ./-v.ini
}
check "-- before a name that begins with -" dashes
: >void.ini
check "an empty file" wrong 0 '^void.ini: has no sections' --check void.ini

ok_check() { run 0 "$FARM" --check everything.ini && echo "$out" | grep -q 'all right' &&
        echo "$out" | grep -qx '  bounding box of all but planes: from -4 -0.2152521 -3 to 4 4.5 4.222471' &&
        [ ! -e everything.png ]; }
check "--check renders nothing" ok_check
far_box() { # digits enough to see how large a small thing is far away; the others end where those of a mesh do
    printf '[sphere]\ncenter = 1e9 29.900000000000002 -12345.678901\nradius = 0.001\n' >far.ini
    run 0 "$FARM" --check far.ini &&
        echo "$out" | grep -qx '  bounding box: from 999999999.999 29.899 -12345.68 to 1000000000.001 29.901 -12345.678'
}
check "--check prints a bounding box that is not flat" far_box
doubled() { # what is left out of a scene is told
    printf '[sphere a]\ncenter = 0 0 0\nradius = 1\n[sphere b]\ncenter = 0 0 0\nradius = 1\n' >doubled.ini
    run 0 "$FARM" --check doubled.ini && echo "$out" | grep -q ' 1 primitive .* without 1 duplicate, '
}
check "--check counts duplicates" doubled
idle() { # a light of no colour, and all where nothing but glass is lit
    printf '[light a]\nposition = 0 5 0\n[light b]\nposition = 5 5 0\ncolor = 0 0 0\n%s' \
        '[sphere a]
center = 0 0 0
radius = 1
material = m
[material m]
' >idle.ini
    run 0 "$FARM" --check idle.ini && echo "$out" | grep -q ', 1 light and 1 that lights nothing, ' &&
        run 0 "$FARM" --check idle.ini 'light b.color=1 1 1' && echo "$out" | grep -q ', 2 lights, ' &&
        run 0 "$FARM" --check idle.ini 'material m.diffuse=0' 'material m.specular=0' &&
        echo "$out" | grep -q ', 0 lights and 2 that light nothing, '
}
check "--check counts lights that light nothing" idle
round_trip() {
    run 0 "$FARM" --print-config everything.ini image.width=40 image.height=30 || return 1
    printf '%s\n' "$out" >again.ini
    run 0 "$FARM" everything.ini image.width=40 image.height=30 output.image=a.pfm || return 1
    run 0 "$FARM" again.ini output.image=b.pfm && cmp a.pfm b.pfm
}
check "--print-config gives the same picture" round_trip
plain_paths() { # without . and .., also of files to come; a folder that is missing stays as it is named
    mkdir -p below/it && cd below/it || return 1
    run 0 "$FARM" --print-config ../../everything.ini output.image=./p.png output.report=../../p.json \
        output.trace=nowhere/../t.json
    status=$? there=$(pwd -P)
    cd ../.. && [ $status -eq 0 ] || return 1
    for line in "file = $(pwd -P)/star.obj" "image = $there/p.png" "report = $(pwd -P)/p.json" \
        "trace = $there/nowhere/../t.json"; do
        echo "$out" | grep -qxF "$line" || { echo "no $line"; return 1; }
    done
}
check "--print-config folds .. in paths" plain_paths
# A printed file gives a picture named after itself, unless the user has named one.
own_names() {
    run 0 "$FARM" again.ini && [ -s again.png ] && [ ! -e everything.png ] &&
        run 0 "$FARM" --print-config everything.ini output.image=named.hdr output.journal= &&
        printf '%s\n' "$out" >named.ini && run 0 "$FARM" named.ini && [ -s named.hdr ] &&
        [ -s named.json ] && [ ! -e named.png ] && grep -q '^journal = $' named.ini
}
check "what --print-config gives has its own picture" own_names
links() { # keep their names, and the folder that what they name is looked for in
    mkdir -p store linked && cp star.obj store/blob && cp star.mtl linked/ && ln -sf ../store/blob linked/star.obj &&
        sed '/^\[include/,$d' everything.ini >linked/l.ini && ln -sf blob linked/l.pfm || return 1
    run 0 "$FARM" --allow-outside linked/l.ini output.image=linked/a.pfm && [ -z "$err" ] &&
        run 0 "$FARM" --allow-outside --print-config linked/l.ini output.image=linked/l.pfm || return 1
    printf '%s\n' "$out" >printed.ini
    run 0 "$FARM" --allow-outside printed.ini && [ -z "$err" ] && cmp linked/a.pfm linked/l.pfm
}
check "--print-config of what links name" links
outside() {
    mkdir -p elsewhere && cp again.ini elsewhere/ || return 1
    run 2 "$FARM" --check elsewhere/again.ini && [ "$(lines "$err")" -eq 1 ] &&
        echo "$err" | grep -q '^elsewhere/again.ini:[0-9]*: .*--allow-outside' &&
        run 0 "$FARM" --check elsewhere/again.ini --allow-outside
}
check "files outside of the scene's folder need --allow-outside" outside
defaults() {
    mkdir -p elsewhere && cd elsewhere || return 1
    run 0 "$FARM" ../everything.ini image.width=8 image.height=8; status=$?
    cd .. && [ $status -eq 0 ] && [ -s elsewhere/everything.png ] && [ -s elsewhere/everything.json ]
}
check "picture and report go to the current folder" defaults
beside() {
    mkdir -p pictures && run 0 "$FARM" everything.ini output.image=pictures/a.b.pfm image.width=8 \
        image.height=8 && [ -s pictures/a.b.pfm ] && [ -s pictures/a.b.json ]
}
check "the report lies beside the picture" beside
printf '[camera]\neye = 0 0 0.5\nlook_at = 0 0 9\n[light]\nposition = 0 9 0\n' >inside.ini
printf '[sphere]\ncenter = 0 0 0\nradius = 1\n' >>inside.ini
empty() { # WHAT SCENE ARGUMENT...: that nothing is to be seen is said once, or, without WHAT, not at all
    said=$1; shift
    run 0 farm_n 2 "$@" image.width=16 image.height=12 output.image=empty.png || return 1
    if [ "$said" ]; then [ "$err" = "farm: $said" ]; else [ -z "$err" ]; fi
}
check "nothing in view" empty 'nothing is in view: no ray from camera.eye has met anything' \
    everything.ini camera.eye='0 0 50' camera.look_at='0 0 99'
check "the inside of a ball" empty 'all pixels have the same colour: is what is in view lit?' inside.ini
check "something in view" empty '' everything.ini
check "a part of nothing" empty '' everything.ini camera.eye='0 0 50' camera.look_at='0 0 99' \
    image.region='0 0 4 4'
for scene in parts.nff star.obj; do
    direct() { run 0 farm_n 2 "$scene" image.width=32 image.height=24 && [ -s "${scene%.*}.png" ]; }
    check "$scene directly" direct
done
finish
