# The rows of a section's CSV file, and what is kept from earlier benches.

# Rows and references of other programs or scene files are invalid.
scene_files() {
    find -L config ${FOLDER:+"$FOLDER"} -type f \
        \( -name '*.ini' -o -name '*.nff' -o -name '*.obj' -o -name '*.mtl' \) -exec cksum {} + | sort
}
STATE="$FOLDER $(cksum <"$FARM") $(cksum <"$TOOL") $(scene_files | cksum)"
# renew FILE SETTINGS OUTPUT...: removes the outputs if programs, scene files or settings differ from those recorded in
# FILE, and records the present ones there.
renew() {
    told=$1 state="$STATE $2"; shift 2
    [ "$(cat "$told" 2>/dev/null)" = "$state" ] && return
    rm -f "$@"
    echo "$state" >"$told"
}

# begin_csv SECTION SETTINGS NAMES-OF-COLUMNS: begins the CSV file of a section. Its old rows are kept if they were
# measured with the same settings and have the same columns.
begin_csv() {
    csv=$OUT/error_$1.csv
    renew "$OUT/.error_$1" "$2 $3" "$csv"
    [ -e "$csv" ] || echo "$3" >"$csv"
}
# put_row FIELD,... [N...]: appends a row. Ends the bench if a field is empty or not a finite number, as the program
# that measures it must have failed. Field N may be a bound that does not exist: null or inf.
put_row() {
    echo "$1" | awk -F, -v open=" ${2:-} " '
        { for (i = 1; i <= NF; i++) if ($i == "" || $i ~ /^[-+]?nan$/ || (!index(open, " " i " ") && $i ~ /^([-+]?inf|null)$/)) exit 1 }' || {
        echo "error.sh: not all of a row of $csv was measured: $1" >&2
        exit 1
    }
    echo "$1" >>"$csv"
}
# known BEGINNING: whether there is a row that begins with these fields.
known() { awk -v begin="$1," 'index($0, begin) == 1 { found = 1 } END { exit !found }' "$csv"; }
