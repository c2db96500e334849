# From the top folder: bench/out/error_claims.svg, what pruned pictures claim to be wrong by, and are.
load 'bench/plot.gp'
CSV = 'bench/out/error_claims.csv'
if (system(sprintf("awk 'NR > 1' %s", CSV)) eq '') exit

# At the edges: what is less than a float shows, and claims where lights are of absurd strength.
NONE = 1e-8
MOST = 100.0
within(x) = x < NONE ? NONE : x < MOST ? x : MOST
# Of pictures with a bound everywhere, by what they are pruned with.
DEFAULT = 1 / 512.0
by_depth(claim) = column(6) == 0 && column(3) == DEFAULT ? within(claim) : NaN
by_cutoff(claim) = column(6) == 0 && column(3) != DEFAULT ? within(claim) : NaN

set output 'bench/out/error_claims.svg'
set title 'What pruned pictures claim to be wrong by, and are'
set xlabel 'largest error of a pixel (white is 1)'
set ylabel 'largest claim of a pixel'
set logscale xy
set format '10^{%T}'
set xrange [NONE / 2:2]
set yrange [NONE / 2:2 * MOST]
set xtics add ('none' NONE)
set ytics add ('none' NONE, 'more' MOST)
set key right bottom noenhanced
plot x with lines lc rgb 'black' title 'claim = error', \
     CSV using (within($8)):(by_depth($7)) every ::1 with points lt 2 pt 7 ps 0.6 title 'max_depth 0 to 20', \
     CSV using (within($8)):(by_cutoff($7)) every ::1 with points lt 4 pt 6 ps 0.8 title 'cutoff 1/16 to 1/65536'
