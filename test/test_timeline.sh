# output.trace, output.heatmap and output.ranks of real runs.
. test/lib.sh
cd "$T" || exit 1
SCENE=$CONFIG/hello.ini

# The pixels of all tiles in the trace, which has one event per line.
traced_pixels() { awk -F'"pixels": ' '/"cat": "tile"/ { sum += $2 + 0 } END { print sum + 0 }' "$1"; }
rows() { grep -c '"thread_name"' "$1"; }

shown() { # N SCHEDULE
    rm -f ./*.json ./*.png
    run 0 farm_n "$1" "$SCENE" image.width=60 image.height=45 farm.schedule="$2" output.image=a.png \
        output.trace=t.json output.heatmap=h.png output.ranks=r.png || return 1
    for told in 'picture a.png' 'report  a.json' 'trace   t.json' 'heatmap h.png' 'ranks   r.png'; do
        echo "$out" | grep -qx "$told" || return 1
    done
    grep -q "\"rank\": 0, \"host\": \"$(uname -n)\"" a.json &&
        head -c 8 h.png | grep -aq PNG && head -c 8 r.png | grep -aq PNG &&
        grep -q '"black_s"' a.json && [ "$(traced_pixels t.json)" -eq 2700 ] &&
        [ "$(rows t.json)" -eq $(($1 > 0 ? $1 : 1)) ]
}
for n in 0 3; do
    for schedule in dynamic strips cyclic; do
        check "trace, heat map and ranks, $schedule, -n $n" shown $n $schedule
    done
done

# What serving takes is noted every 0.05 s, and at the end.
serving() {
    run 0 farm_n 2 "$SCENE" image.width=60 image.height=45 farm.master_renders=no output.image=a.png \
        output.trace=t.json && [ "$(rows t.json)" -eq 1 ] &&
        [ "$(grep -c '"name": "rank 0 serves", "ph": "C"' t.json)" -ge 2 ]
}
check "the trace tells of a rank 0 that only serves" serving

# The trace must have the samples of all passes, and bars for planning. Renderers that still do useless work have
# shorter such bars.
passes() { # N
    run 0 farm_n "$1" "$SCENE" image.width=200 image.height=150 sampling.target_error=0.002 output.image=a.png \
        output.trace=t.json output.error=e.csv || return 1
    sampled=$(awk -F'"samples": ' '/"cat": "tile"/ { sum += $2 + 0 } END { print sum / 30000 }' t.json)
    told=$(tail -n 1 e.csv | awk -F, '{ print $2 + 0 }')
    [ "$sampled" = "$told" ] || return 1
    passes=$(sed -n 's/.*"passes": \([0-9]*\).*/\1/p' a.json)
    last=$(awk -F'"pass": ' '/"cat": "tile"/ && $2 + 0 > most { most = $2 + 0 } END { print most + 0 }' t.json)
    [ "$passes" -gt 1 ] && [ "$last" -eq $((passes - 1)) ] &&
        grep -q '"cat": "planning".*{"pass": 1}' t.json
}
for n in 0 3; do check "trace of passes, -n $n" passes $n; done

# The times in the report must add up to the total. Rays and pixels are those of the picture, or more if something was
# rendered twice.
adds_up() {
    run 0 farm_n 3 "$CONFIG/lantern.ini" image.width=320 image.height=240 sampling.samples=4 output.image=a.png ||
        return 1
    awk '
        /"[a-z]*_s": / { split($0, part, /[:,]/); gsub(/[ "]/, "", part[1])
            if (!(part[1] in of)) of[part[1]] = part[2] + 0 }
        /"primary": / { primary = $2 + 0 }
        /"file": "config|"file": "\// { scene = $0 ~ /lantern.ini"/ }
        /"rank": / {
            workers++
            line = $0; gsub(/[{}" ]/, "", line); count = split(line, field, ",")
            for (i = 1; i <= count; i++) { split(field[i], pair, ":"); is[pair[1]] = pair[2] + 0 }
            pixels += is["pixels"]
            away = is["busy_s"] + is["wait_s"] + is["send_s"] - of["render_s"]
            if (away > 0.001 || away < -0.001 || is["finish_s"] > of["render_s"] || is["cpu_s"] <= 0) bad = 1
        }
        END {
            sum = of["init_s"] + of["load_s"] + of["broadcast_s"] + of["build_s"] + of["render_s"] + of["write_s"]
            print sum, of["total_s"], primary, pixels, workers, of["init_s"], of["build_s"], of["broadcast_s"], scene
            if (sum > of["total_s"] || sum < 0.5 * of["total_s"] || of["init_s"] <= 0 || of["load_s"] <= 0) bad = 1
            if (of["build_s"] <= of["broadcast_s"] || of["write_s"] <= 0 || of["service_s"] <= 0 || !scene) bad = 1
            exit bad || primary < 320 * 240 * 4 || pixels < 320 * 240 || workers != 3
        }' a.json
}
check "the report adds up" adds_up

# A rank 0 that only serves sleeps meanwhile. It takes about a hundredth of a core; polling all the time would take a
# tenth and more.
sleeps() {
    run 0 farm_n 2 "$CONFIG/lantern.ini" image.width=160 image.height=120 sampling.samples=64 output.image=a.png \
        farm.master_renders=no || return 1
    awk '
        /"render_s": / && !render { render = $2 + 0 }
        /"master": / { getline; cpu = $2 + 0 }
        END { print cpu, render; exit !(cpu > 0 && cpu < 0.05 * render) }' a.json
}
check "a master that waits sleeps" sleeps

part() { # of the picture: the heat map is of the same pixels
    run 0 "$FARM" "$SCENE" image.width=60 image.height=45 image.region="3 4 10 20" output.image=p.pfm \
        output.heatmap=h.pfm && [ "$(sed -n 2p h.pfm)" = '10 20' ]
}
check "a heat map of a region" part

unshown() {
    run 0 "$FARM" "$SCENE" image.width=8 image.height=6 output.image=b.png &&
        ! grep -q '"heatmap": {' b.json
}
check "none of them unless asked for" unshown

wrong() { # PATTERN ARGUMENT...
    pattern=$1; shift
    run 2 "$FARM" "$SCENE" "$@" || return 1
    echo "$err"
    [ "$(lines "$err")" -eq 1 ] && echo "$err" | grep -q "$pattern"
}
check "a trace is .json" wrong 'trace has an unknown extension' output.trace=t.txt
check "a heat map is a picture" wrong 'heatmap has an unknown extension' output.heatmap=h.json
check "no two outputs in one file" wrong 'ranks is also the name of the heatmap' output.ranks=a.png \
    output.heatmap=a.png
check "nor over the picture" wrong 'ranks is also the name of the image' output.image=a.png \
    output.ranks=a.png
check "nor over the report" wrong 'trace is also the name of the report' output.report=a.json \
    output.trace=a.json
check "a folder that is missing" wrong 'output.ranks=FILE' output.ranks=missing/r.png

full() { # KEY
    run 1 "$FARM" "$SCENE" image.width=8 image.height=6 output.image=c.png "$1=/dev/full" &&
        echo "$err" | grep -q "$1=FILE"
}
check "no space for the trace" full output.trace
for key in heatmap ranks; do
    ln -s /dev/full $key.png
    full_picture() {
        run 1 "$FARM" "$SCENE" image.width=8 image.height=6 output.image=c.png output.$key=$key.png &&
            echo "$err" | grep -q "$key.png: cannot write: No space left"
    }
    check "no space for output.$key" full_picture
done
finish
