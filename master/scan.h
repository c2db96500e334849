/* Reading line-oriented text (NFF, OBJ, MTL) in place: blanks separate words, '#' starts a comment.
 */
#ifndef FARM_MASTER_SCAN_H
#define FARM_MASTER_SCAN_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include "common/vec.h"

struct scan {
    const char *at;   /* text ends with NUL */
    const char *path; /* for messages */
    long line;        /* number of the line that `at` is in */
    bool too_large;   /* the last number that was refused is one, but no double holds it */
    bool joins;       /* a backslash at the end of a line joins the next one to it */
};

/* The end of a message about a number that is one, but too large (scan.too_large). */
#define NUMBER_TOO_LARGE "a number is out of range, expected none beyond 1.79e308"

struct scan scan_start(const char *text, const char *path, bool joins);

/* Moves to the next line that holds a word; false at the end of the text. */
bool scan_next_line(struct scan *scan);

/* Skips blanks; whether nothing is left on the line. */
bool scan_at_end(struct scan *scan);

/* Each takes one item off the line, or leaves it and returns false; nothing is said. */
bool scan_number(struct scan *scan, double *value);
bool scan_vector(struct scan *scan, struct vec3 *value);
bool scan_unsigned(struct scan *scan, uint32_t *value);
/* The next word, cut at size - 1 bytes; false when the line is at its end. */
bool scan_word(struct scan *scan, char *word, size_t size);
/* The rest of the line without blanks at its ends (no comment is looked for), cut like a word. */
bool scan_rest(struct scan *scan, char *text, size_t size);

#endif
