/* Prints what was measured, as tables. */
#ifndef FARM_BENCH_KERNEL_REPORT_H
#define FARM_BENCH_KERNEL_REPORT_H

#include <stdio.h>

#include "bench/kernel_picture.h"
#include "bench/kernel_run.h"

#define REPEAT_MAX 99

struct series {
    unsigned count;
    bool failed;
    struct measurement runs[REPEAT_MAX];
};

struct scene_results {
    struct kernel_scene scene;
    struct series series[PROGRAM_COUNT][STEP_COUNT];
    struct picture_difference
        difference[PROGRAM_COUNT]; /* from the farm's picture; NAN: not measured */
};

/* Prints a line for the terminal, with the table head above the first one. */
void report_scene(FILE *out, const struct scene_results *results, bool first);

/* Prints geometric means, and a verdict for every mark. */
void report_summary(FILE *out, const struct scene_results *results, size_t count);

/* Write all medians, and the tables. These end the program when the file cannot be written. */
void report_csv(const char *path, const struct scene_results *results, size_t count);
void report_markdown(const char *path, const struct scene_results *results, size_t count);

#endif
