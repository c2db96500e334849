/*
 * Decimal numbers as text: [+-] digits [. digits] [e [+-] digits], with at least one digit before the
 * exponent. Hexadecimal, "inf" and "nan" are not accepted; the locale does not matter. The result is the
 * nearest double. A number too large for a double is refused, one too small becomes 0 or subnormal.
 */
#ifndef FARM_MASTER_NUMBER_H
#define FARM_MASTER_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/*
 * Reads the number at text (no leading blanks; text ends with NUL). Returns a pointer to its end, or NULL if
 * there is no number. The caller judges what follows, and has to refuse an infinite value: that is what a
 * number too large for a double becomes.
 */
const char *number_scan(const char *text, double *value);

/* The same for text that must be a number as a whole; refuses infinite values. */
bool number_parse(const char *text, double *value);

/* Reads decimal digits, at most UINT32_MAX. Returns a pointer to their end, or NULL if there is no such
 * number. */
const char *number_scan_unsigned(const char *text, uint32_t *value);

/* The same for text that must be such a number as a whole. */
bool number_parse_unsigned(const char *text, uint32_t *value);

#define NUMBER_TEXT_SIZE 32

/* Formats a finite value as the first of %.15g, %.16g and %.17g that reads back as the same double. */
const char *number_format(double value, char text[NUMBER_TEXT_SIZE]);

#endif
