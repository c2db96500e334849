/* Formats numbers as short figures that can be read in passing, for the progress display and the table. */
#ifndef FARM_MASTER_FIGURE_H
#define FARM_MASTER_FIGURE_H

struct figure {
    char text[16];
};

/* "0", "999", "1.2k", "34.5M", "6.0G", "7.0T", "> 999T"; value >= 0, at most 6 characters. */
struct figure figure_count(double value);

/* "0:07", "12:34", "1:02:03", "> 999 h"; seconds >= 0, at most 9 characters. */
struct figure figure_span(double seconds);

/* So many significant digits, 1 to 6, also where the last ones are zeros: "0.0030", "41.0", "130" of 128 with two. An
 * exponent stands below 1e-7 and from 1e6 on: "3.0e-12". 0 is "0". */
struct figure figure_digits(double value, int digits);

/* A round value, such as one that a user typed: 6 significant digits, but no zeros at the end. The exponents are those
 * of figure_digits(). */
struct figure figure_round(double value);

#endif
