# From the top folder: bench/out/faults.svg, what faults cost, run by run.
WIDTH = 800
HEIGHT = 560
load 'bench/plot.gp'
CSV = 'bench/out/faults.csv'

# Where no run left a journal with tiles, there is nothing to be seen.
if (system(sprintf("awk -F, 'NR > 1 && $7 > 0' %s", CSV)) eq '') exit

kinds = system(sprintf("awk -F, 'NR > 1 { print $2 }' %s | sort -u", CSV))
faults(kind) = system(sprintf("awk -F, '$2 == \"%s\" && $12 == \"yes\"' %s | wc -l", kind, CSV))
at(kind) = sum [i=1:words(kinds)] (word(kinds, i) eq kind ? i : 0)
# Runs of a kind lie beside each other, what was saved above its line and what was repeated below.
beside(run) = 0.1 + 0.06 * (int(run) % 5)
# Of those that left one.
resumed(x) = column(7) > 0 ? x : NaN

set output 'bench/out/faults.svg'
set title 'What of the work before a fault was taken over, and what was done again'
set xlabel 'seconds of rendering, of all renderers together; each mark is a run'
set ylabel 'kind (faults injected)'
set yrange [words(kinds) + 0.6:0.4]
set xrange [0:*]
set offsets 0, graph 0.03, 0, 0
set ytics scale 0 ()
set for [i=1:words(kinds)] ytics add (sprintf('%s (%s)', word(kinds, i), faults(word(kinds, i))) i)
set key above
plot CSV using (resumed($9)):(at(strcol(2)) - beside($0)) every ::1 with points lt 2 pt 7 ps 0.9 title 'saved', \
     CSV using (resumed($10)):(at(strcol(2)) + beside($0)) every ::1 with points lt 4 pt 6 ps 0.9 lw 1.5 \
         title 'repeated'
