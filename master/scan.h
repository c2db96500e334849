/* Scans line-oriented text (NFF, OBJ, MTL) in place: blanks separate words, '#' starts a comment. */
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
    bool too_large;   /* the last number that was refused is valid but too large for a double */
    bool joins;       /* a backslash at the end of a line continues it on the next one */
};

/* The end of the message about a number that is too large for a double (scan.too_large). */
#define NUMBER_TOO_LARGE "a number is out of range, expected none beyond 1.79e308"

/* Text and path are the caller's, and valid as long as the result. joins: as in struct scan. */
struct scan scan_start(const char *text, const char *path, bool joins);

/* Moves to the next line that holds a word; false at the end of the text. */
bool scan_next_line(struct scan *scan);

/* Skips blanks; returns whether nothing but a comment is left on the line. */
bool scan_at_end(struct scan *scan);

/* Each reads one item of the line, or returns false without reading anything or reporting an error. */
bool scan_number(struct scan *scan, double *value);
bool scan_vector(struct scan *scan, struct vec3 *value);
bool scan_unsigned(struct scan *scan, uint32_t *value);
/* Reads what C libraries write for a number that is not finite, which scan_number() refuses: nan, -nan(ind), inf,
 * 1.#QNAN. */
bool scan_not_finite(struct scan *scan);
/* Reads the next word if it is this one. */
bool scan_take(struct scan *scan, const char *word);
/* Reads the next word, truncated to size - 1 bytes; false at the end of the line. */
bool scan_word(struct scan *scan, char *word, size_t size);
/* Reads the rest of the line, including a comment, without blanks at its ends; truncated like a word. */
bool scan_rest(struct scan *scan, char *text, size_t size);

#endif
