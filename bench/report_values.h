/* Reads the few values that benches want from farm's JSON reports, without a parser. */
#ifndef FARM_BENCH_REPORT_VALUES_H
#define FARM_BENCH_REPORT_VALUES_H

/* The text of a file, which the caller frees; ends the program when it cannot be read. */
char *report_text(const char *path);

/* The number after the first "key": in text; ends the program when there is none. */
double report_number(const char *text, const char *key);

#endif
