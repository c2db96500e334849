/*
 * Decimal numbers as text: [+-] digits [. digits] [e [+-] digits], at least one digit before the
 * exponent. No hexadecimal, no "inf", no "nan", whatever the locale. The nearest double is given; a
 * number too large for one is refused, one too small becomes 0 or subnormal.
 */
#ifndef FARM_COMMON_NUMBER_H
#define FARM_COMMON_NUMBER_H

#include <stdbool.h>
#include <stdint.h>

/*
 * Reads a number that begins at text (no leading blanks; text ends with NUL). Returns where it
 * ends, or NULL when there is none; what follows is for the caller to judge. A number too large for
 * a double becomes infinite: the caller has to refuse it.
 */
const char *number_scan(const char *text, double *value);

/* The same for text that must be a number from its beginning to its end. */
bool number_parse(const char *text, double *value);

/* Decimal digits only, at most UINT32_MAX; returns where they end, or NULL: there is no such number. */
const char *number_scan_unsigned(const char *text, uint32_t *value);

/* The same of the whole text. */
bool number_parse_unsigned(const char *text, uint32_t *value);

#define NUMBER_TEXT_SIZE 32

/* The first of %.15g, %.16g, %.17g that reads back as the same double; value is finite. */
const char *number_format(double value, char text[NUMBER_TEXT_SIZE]);

#endif
