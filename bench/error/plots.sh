# What all plots have in common.

# For gnuplot: the axes of all plots. Seconds have tics at 1, 2 and 5 times powers of ten, as a plot covers one or two
# octaves of them.
LOGLOG='load "bench/plot.gp"
set logscale xy
set for [e=-3:4] xtics add (sprintf("%g", 10.0 ** e) 10.0 ** e, sprintf("%g", 2 * 10.0 ** e) 2 * 10.0 ** e, \
    sprintf("%g", 5 * 10.0 ** e) 5 * 10.0 ** e)
set autoscale xfix
set offsets graph 0.05, graph 0.05
set rmargin 4'

# Runs gnuplot with the commands from standard input.
plot() { gnuplot || { echo "error.sh: gnuplot failed" >&2; exit 1; }; }
