# From the top folder: bench/out/stability.svg, errors and wrong decisions of the catalogue, row by row.
CSV = 'bench/out/stability.csv'
ROWS = int(system(sprintf("awk 'NR > 1' %s | wc -l", CSV)))
if (ROWS == 0) exit
WIDTH = 1200
HEIGHT = 130 + 16 * ROWS
load 'bench/plot.gp'

# Errors in parts of what the row's pass mark allows, where it tells of errors; what is no number has an infinite one.
HUGE = 1e30
part(worst, limit) = limit > 0 ? (worst < HUGE * limit ? worst / limit : HUGE) : NaN
# Shares of samples in per cent: below the smallest that can be counted where there are none.
NONE = 1e-9
share(wrong, samples) = samples > 0 ? (wrong > 0 ? 100.0 * wrong / samples : NONE) : NaN
# Number and name; names have commas, at which gnuplot would cut them off.
label(row) = system(sprintf("awk -F'\"' 'NR == %d { sub(/,/, \"\", $1); \
    print $2 (/,RED,/ ? \" (RED)\" : /,marked,/ ? \" (marked)\" : \"\") \"  \" $1 }' %s", row + 2, CSV))

set output 'bench/out/stability.svg'
set multiplot
set yrange [ROWS - 0.5:-0.5]
set ytics scale 0 noenhanced ()
set for [row=0:ROWS-1] ytics add (label(row) row)
set logscale x
set tmargin at screen 1 - 60.0 / HEIGHT
set bmargin at screen 60.0 / HEIGHT
set key at screen 0.01, screen 1 - 8.0 / HEIGHT left top Left reverse samplen 1

set lmargin at screen 0.4
set rmargin at screen 0.74
set title 'largest error'
set xlabel 'parts of what the pass mark allows'
set format x '10^{%T}'
set offsets graph 0.03, graph 0.03, 0, 0
$MARK << END
1,0
1,1
END
plot $MARK using 1:(ROWS * $2 - 0.5) with lines lc rgb 'black' notitle, \
     CSV using (part($8, $9)):0 every ::1 with points lt 2 pt 7 ps 0.8 notitle, \
     CSV using (part($10, $9)):0 every ::1 with points lt 4 pt 6 ps 0.8 lw 1.5 notitle

set lmargin at screen 0.76
set rmargin at screen 0.98
set title 'wrong decisions'
set xlabel '% of samples'
set xrange [NONE / 3:300]
set xtics ('none' NONE, '10^{-6}' 1e-6, '10^{-4}' 1e-4, '0.01' 0.01, '1' 1, '100' 100)
set format y ''
set ytics scale 0 ()
plot CSV using (share($12, $5)):0 every ::1 with points lt 2 pt 7 ps 0.8 title 'exact formulas', \
     CSV using (share($13, $14)):0 every ::1 with points lt 4 pt 6 ps 0.8 lw 1.5 \
         title 'the paper''s, where they are compared'
unset multiplot
