# What all plots have in common. WIDTH and HEIGHT may be told before.
if (!exists('WIDTH')) WIDTH = 640
if (!exists('HEIGHT')) HEIGHT = 480
set terminal svg size WIDTH,HEIGHT font 'sans,12' background 'white'
set datafile separator ','
set grid lc rgb '#dddddd'
