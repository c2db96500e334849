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

#endif
