# Errors and intervals for synthetic pictures of objects that few samples hit.

fields() {
    count=${ERROR_FIELDS:-400}
    {
        echo "# What few samples meet: $count fields of discs, needles and hairs, 96 x 96, to six errors from 0.03 to 0.0015"
        echo
        "$TOOL" fields "$count" || exit 1
    } >"$WORK/fields.md"
    mv "$WORK/fields.md" "$OUT/error_fields.md"
}
