/*
 * The instruction sets that the kernel may use. The kernel is compiled for several levels of x86-64
 * processor, all of which give bit-identical results; each process chooses among those that its processor
 * supports.
 */
#ifndef FARM_COMMON_PROCESSOR_H
#define FARM_COMMON_PROCESSOR_H

#include <stdbool.h>

enum processor_level {
    PROCESSOR_AUTO,     /* the highest that processor_has() */
    PROCESSOR_PORTABLE, /* the baseline of the architecture */
    PROCESSOR_AVX2,     /* with FMA, BMI1, BMI2, LZCNT and POPCNT */
    PROCESSOR_AVX512,   /* AVX2 and its companions, and AVX-512 F, VL and DQ */
    PROCESSOR_LEVELS
};

/* "auto", "portable", ..., then NULL, as struct key wants it. */
extern const char *const processor_level_names[PROCESSOR_LEVELS + 1];

/* Whether this processor supports the level, and the kernel was built for it (LEVELS in the Makefile). */
bool processor_has(enum processor_level level);

/* Which of the two is missing where processor_has() is false, for messages: "not for this processor", or "not in this
 * build". */
const char *processor_lacks(enum processor_level level);

/* A text such as "auto, portable or avx2": auto and the levels for which has() is true. The caller frees it. */
char *processor_choices(bool (*has)(enum processor_level level));

/* For PROCESSOR_AUTO the highest level that processor_has(), else the level itself. */
enum processor_level processor_resolve(enum processor_level level);

#endif
