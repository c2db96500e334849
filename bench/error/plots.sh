# What all plots have in common.

# For gnuplot: the axes of all plots.
LOGLOG='load "bench/plot.gp"
set logscale xy
set for [e=-3:4] xtics add @TICS
set autoscale xfix
set offsets graph 0.05, graph 0.05
set rmargin 4'

# Runs gnuplot with the commands from standard input.
plot() { gnuplot || { echo "error.sh: gnuplot failed" >&2; exit 1; }; }
