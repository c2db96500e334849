# From the top folder: bench/out/omit.svg, what leaving out saves, case by case.
WIDTH = 900
HEIGHT = 560
load 'bench/plot.gp'
CSV = 'bench/out/omit.csv'
if (system(sprintf("awk 'NR > 1' %s", CSV)) eq '') exit

saved(own, full) = 100 * (1 - own / full)
# Bytes are the same in most cases.
some(percent) = percent > 0 ? percent : NaN

set output 'bench/out/omit.svg'
set title 'What leaving out saves'
set xlabel 'saved, % of what the full variant takes'
set ylabel 'the scene lacks'
set yrange [*:*] reverse
set offsets 0, 0, 0.7, 0.7
set ytics scale 0 noenhanced
set key above left Left reverse
set arrow 1 from 0, graph 0 to 0, graph 1 nohead lc rgb 'black'
plot CSV using (saved($2, 1)):0:(saved($4, 1)):(saved($3, 1)):ytic(1) every ::1 with xerrorbars lt 1 lw 2 pt 7 \
         title 'CPU time: median, least and most of the pairs', \
     CSV using (some(saved($7, $8))):0 every ::1 with points lt 2 pt 4 ps 1.2 lw 2 \
         title 'bytes of the scene, where it saves any'
