/* Reading farm's JSON reports: the few values that benches want, without a parser. */
#ifndef FARM_BENCH_REPORT_VALUES_H
#define FARM_BENCH_REPORT_VALUES_H

/* The whole file, which the caller frees; the program ends when it cannot be read. */
char *report_text(const char *path);

/* The number behind the first "key": from here on; the program ends when there is none. */
double report_number(const char *text, const char *key);

#endif
