# From the top folder: bench/out/kernel.svg, what part of the peers' CPU time of rendering the farm takes.
WIDTH = 800
load 'bench/plot.gp'
CSV = 'bench/out/kernel.csv'

# Of each peer and scene one row has a ratio: median, least and most of the rounds.
HAS_RATIO = '$18 + 0 > 0'
rows_of(peer) = sprintf("< awk -F, '$2 == \"%s\" && %s' %s", peer, HAS_RATIO, CSV)
all_in(column) = system(sprintf("awk -F, '%s && !seen[$%d]++ { print $%d }' %s", HAS_RATIO, column, column, CSV))
scenes = all_in(1)
peers = all_in(2)
if (words(peers) == 0) exit

at(list, name) = sum [i=1:words(list)] (word(list, i) eq name ? i : 0)
written(peer) = peer eq 'embree' ? 'Embree' : peer eq 'tachyon' ? 'Tachyon' : 'POV-Ray'
array MEAN[words(peers)]
do for [i=1:words(peers)] {
    stats rows_of(word(peers, i)) using (log($18)) nooutput
    MEAN[i] = exp(STATS_mean)
}

set output 'bench/out/kernel.svg'
set title 'CPU time of rendering: median, least and most of the rounds'
set ylabel 'farm / peer'
set logscale y
set autoscale yfix
set offsets 0, 0, graph 0.05, graph 0.05
set xrange [0.5:words(scenes) + 0.5]
set for [e=-3:2] ytics add @TICS
set xtics scale 0 rotate by -30 noenhanced ()
set for [i=1:words(scenes)] xtics add (word(scenes, i) i)
set key above
plot 1 with lines lc rgb 'black' title 'equally fast', \
     for [i=1:words(peers)] rows_of(word(peers, i)) \
         using (at(scenes, strcol(1)) + 0.12 * (i - 0.5 * (words(peers) + 1))):18:19:20 with yerrorbars lt i lw 2 pt 7 \
         title sprintf('%s (geometric mean %.2g)', written(word(peers, i)), MEAN[i])
