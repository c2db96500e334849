# From the top folder: bench/out/faults_cost.svg, what the journal costs, pair by pair.
load 'bench/plot.gp'
CSV = 'bench/out/faults_cost.csv'
if (system(sprintf("awk 'NR > 1' %s", CSV)) eq '') exit

set output 'bench/out/faults_cost.svg'
set title 'What the journal costs'
set xlabel 'pair of runs'
set ylabel 'with a journal / without'
set xtics 1
set offsets 0.5, 0.5, graph 0.05, graph 0.05
set key above
set arrow 1 from graph 0, first 1 to graph 1, first 1 nohead lc rgb 'black'
plot CSV using 1:($2 / $4) every ::1 with points lt 2 pt 7 title 'CPU time of the run', \
     CSV using 1:($3 / $5) every ::1 with points lt 4 pt 6 lw 1.5 title 'wall time of rendering'
