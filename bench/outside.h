/* What benches take from outside and leave there: the environment, and files that they write. */
#ifndef FARM_BENCH_OUTSIDE_H
#define FARM_BENCH_OUTSIDE_H

#include <errno.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"

/* FARM, the program, and MPIEXEC are told as to the tests. Of a variable that is empty or not there, fallback. */
static inline const char *from_environment(const char *name, const char *fallback)
{
    const char *value = getenv(name);
    return value && *value ? value : fallback;
}

/* A file to be written from its beginning; ends the program when it cannot be. */
static inline FILE *open_to_write(const char *path)
{
    FILE *file = fopen(path, "w");
    if (!file) fatal("%s cannot be written: %s", path, strerror(errno));
    return file;
}

/* Ends the program when not all of it could be written. */
static inline void close_written(FILE *file, const char *path)
{
    bool failed = ferror(file) != 0;
    if (fclose(file) != 0 || failed) fatal("%s cannot be written", path);
}

#endif
