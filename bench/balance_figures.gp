# From the top folder: bench/out/balance_fig10.svg to balance_fig13.svg, the paper's figures 10 to 13, simulated.
OUT = 'bench/out/balance_'
table(kind, scene) = sprintf('%s%s_%s.csv', OUT, kind, scene)
SCENES = 'lantern garden'
# With --only other sections there may be none.
if (system(sprintf('ls %s 2>/dev/null', table('send_16', 'garden'))) eq '') exit

# As of bench_scenes in bench/balance_kept.c.
array PAPER[2] = [14, 25]
PAPER_PROCESSORS = 44
COLORS = '#b2182b #ef8a62 #999999 #67a9cf #2166ac'
do for [i=1:words(COLORS)] { set linetype i lc rgb word(COLORS, i) lw 2 }
LINES = "for [i=2:6] table(kind, scene) using 1:i with linespoints lt i-1 pt 7 ps 0.3 title columnheader(i)"

# Settings of all of a figure's plots, in `columns` columns and `rows` rows.
BEGIN = "reset; WIDTH = 480 * columns; HEIGHT = 400 * rows; load 'bench/plot.gp'; \
    set output sprintf('%sfig%d.svg', OUT, figure); set key top left Left reverse samplen 2; \
    set multiplot layout rows,columns"

figure = 10; rows = 1; columns = 2; kind = 'time'
@BEGIN
set key bottom left
set xlabel 'processors'
set ylabel 'render time, s'
set logscale y
set xrange [0:45]
do for [scene in SCENES] {
    set title sprintf('%s: time (simulated)', scene)
    plot @LINES
}
unset multiplot

figure = 11; kind = 'speedup'
@BEGIN
set xlabel 'processors'
set ylabel 'speed-up'
set xrange [0:46]
set yrange [0:46]
set size ratio 1
do for [k=1:2] {
    scene = word(SCENES, k)
    set title sprintf('%s: speed-up (simulated)', scene)
    plot x with lines lc rgb '#000000' dt 3 title 'ideal', @LINES, \
         '+' using (PAPER_PROCESSORS):(PAPER[k]) every ::0::0 with points pt 5 ps 1.2 lc rgb 'black' \
         title sprintf('paper: %d', PAPER[k])
}
unset multiplot

figure = 12; rows = 2; columns = 3
@BEGIN
set xlabel 'rank'
set ylabel 'finished after, s'
set yrange [0:*]
set key outside bottom center horizontal
do for [scene in SCENES] {
    do for [processors in '14 16 18'] {
        kind = 'finish_' . processors
        set title sprintf('%s, %s processors (simulated)', scene, processors)
        plot @LINES
    }
}
unset multiplot

figure = 13; rows = 1; columns = 2; kind = 'send_16'
@BEGIN
set xlabel 'rank'
set ylabel 'sending, ms'
set yrange [0:*]
set key outside bottom center horizontal
do for [scene in SCENES] {
    set title sprintf('%s, 16 processors (simulated)', scene)
    plot @LINES
}
unset multiplot
