# From the top folder: bench/out/balance_plan.svg, how well farms that are not here are used.
WIDTH = 1200
HEIGHT = 480
load 'bench/plot.gp'
CSV = 'bench/out/balance_plan.csv'
# With --only other sections there may be none.
if (system(sprintf("awk 'NR > 1' %s 2>/dev/null", CSV)) eq '') exit

# Names have commas, and go: 1 is the scene, 2 renderers, 3 samples, 6 efficiency, 7 the part of the time that the
# master is busy.
rows(what, scene, samples) = sprintf("< grep '^\"%s\",%s,[0-9]*,%s,1.0e-05,' %s | sed 's/^\"[^\"]*\",//'", \
    what, scene, samples, CSV)
SAMPLES = '16 256 4096'
array COLOR[3] = [1, 2, 4]
color(samples) = samples < 100 ? COLOR[1] : samples < 1000 ? COLOR[2] : COLOR[3]
FURTHER = '"second level: nodes of 16" "second level: nodes of 32" \
           "index in a window, tiles of 16" "index in a window, tiles of 8"'
array MARK[4] = [9, 11, 4, 12]
# The lines of either plot: column `shown` in per cent.
LINES = "for [i=1:3] rows('one master', 'garden', word(SAMPLES, i)) using 2:(100 * column(shown)) with linespoints \
         lt COLOR[i] lw 2 pt 7 title sprintf('garden, %s samples', word(SAMPLES, i)), \
     rows('one master', 'lantern', '4096') using 2:(100 * column(shown)) with linespoints lt COLOR[3] lw 2 pt 6 dt 3 \
         title 'lantern, 4096 samples', \
     rows('one master, speeds 0.5 to 2', 'garden', '4096') using 2:(100 * column(shown)) with linespoints lt COLOR[3] \
         lw 2 pt 5 dt 2 title 'garden, speeds 0.5 to 2', \
     for [i=1:4] rows(word(FURTHER, i), 'garden', '[0-9]*') using 2:(100 * column(shown)):(color($3)) with points \
         pt MARK[i] ps 1.4 lw 2 lc variable notitle, \
     for [i=1:4] NaN with points pt MARK[i] ps 1.4 lw 2 lc rgb 'black' title word(FURTHER, i)"

set output 'bench/out/balance_plan.svg'
set multiplot
set bmargin at screen 0.13
set tmargin at screen 0.9
set logscale x
set xlabel 'renderers'
set xrange [700:150000]
set yrange [0:105]
set format x '10^{%T}'
set key off
set lmargin at screen 0.04
set rmargin at screen 0.37
set title 'Farms that are not here (simulated): efficiency, %'
shown = 6
plot @LINES
set lmargin at screen 0.43
set rmargin at screen 0.74
set title 'rank 0 is busy, % of the time'
set key at screen 0.75, graph 1 left top Left reverse samplen 3
shown = 7
plot @LINES
unset multiplot
