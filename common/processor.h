/*
 * Which instructions the kernel may use. It is compiled for several levels of x86-64 processor, all
 * of which give the same bits; each process chooses among those that its processor has.
 */
#ifndef FARM_COMMON_PROCESSOR_H
#define FARM_COMMON_PROCESSOR_H

#include <stdbool.h>

enum processor_level {
    PROCESSOR_AUTO,     /* the highest that there is */
    PROCESSOR_PORTABLE, /* what every processor of the architecture has */
    PROCESSOR_AVX2,     /* with FMA, BMI1, BMI2, LZCNT and POPCNT */
    PROCESSOR_AVX512,   /* with F, VL and DQ as well */
    PROCESSOR_LEVELS
};

/* "auto", "portable", ..., then NULL, as struct key wants it. */
extern const char *const processor_level_names[PROCESSOR_LEVELS + 1];

/* Whether this processor has it. */
bool processor_has(enum processor_level level);

/* "auto, portable or avx2": auto and the levels that has() tells of, as text that the caller frees. */
char *processor_choices(bool (*has)(enum processor_level level));

/* The highest level that it has, for PROCESSOR_AUTO; else the level itself. */
enum processor_level processor_resolve(enum processor_level level);

#endif
