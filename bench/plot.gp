# What all plots have in common. WIDTH and HEIGHT may be told before.
if (!exists('WIDTH')) WIDTH = 640
if (!exists('HEIGHT')) HEIGHT = 480
set terminal svg size WIDTH,HEIGHT font 'sans,12' background 'white'
set datafile separator ','
set grid lc rgb '#dddddd'
# Tics of a logarithmic axis at 1, 2 and 5 times the power e of ten.
TICS = "(sprintf('%g', 10.0 ** e) 10.0 ** e, sprintf('%g', 2 * 10.0 ** e) 2 * 10.0 ** e, \
    sprintf('%g', 5 * 10.0 ** e) 5 * 10.0 ** e)"
