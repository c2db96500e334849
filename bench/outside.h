/* Environment variables that benches read, and files that they write. */
#ifndef FARM_BENCH_OUTSIDE_H
#define FARM_BENCH_OUTSIDE_H

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

/* The value of an environment variable, or fallback if it is empty or not set. FARM (the program) and MPIEXEC
 * are the same as for the tests. */
static inline const char *from_environment(const char *name, const char *fallback)
{
    const char *value = getenv(name);
    return value && *value ? value : fallback;
}

/* Opens a file for writing; ends the program when that fails. */
static inline FILE *open_to_write(const char *path)
{
    FILE *file = fopen(path, "w");
    if (!file) fatal("%s cannot be written: %s", path, strerror(errno));
    return file;
}

/* Closes a file; ends the program when not all of it could be written. */
static inline void close_written(FILE *file, const char *path)
{
    bool failed = ferror(file) != 0;
    if (fclose(file) != 0 || failed) fatal("%s cannot be written", path);
}

#endif
