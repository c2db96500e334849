# Numbers of the farm's reports, and medians, for the scripts that source this file.

# value FILE KEY [head]: the last number with this key, or the first one.
value() { sed -n "s/.*\"$2\": \"\\{0,1\\}\\([^\",}]*\\).*/\\1/p" "$1" | "${3:-tail}" -n 1; }
# of FILE OBJECT KEY: a number in an object.
of() { sed -n "/^  \"$2\": {/,/^  }/s/.*\"$3\": \"\{0,1\}\([^\",}]*\).*/\1/p" "$1" | head -n 1; }
# cpu_of FILE: CPU seconds of rendering, serving and planning.
cpu_of() { sed -n 's/.*"cpu_s": \([0-9.]*\),.*/\1/p' "$1" | awk '{ s += $1 } END { print s }'; }

# The median of numbers, one per line; of those that are arguments.
median() { sort -n | awk '{ v[NR] = $1 } END { print (v[int((NR + 1) / 2)] + v[int(NR / 2) + 1]) / 2 }'; }
median_of() { for t; do echo "$t"; done | median; }
