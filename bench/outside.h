/* Environment variables and lists of names that benches read, commands that they run, and files that they write. */
#ifndef FARM_BENCH_OUTSIDE_H
#define FARM_BENCH_OUTSIDE_H

#include <errno.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>

#include "common/message.h"

/* The value of an environment variable, or fallback if it is empty or not set. FARM (the program) and MPIEXEC
 * are the same as for the tests. */
static inline const char *from_environment(const char *name, const char *fallback)
{
    const char *value = getenv(name);
    return value && *value ? value : fallback;
}

/* Whether a word is in a list with commas. */
static inline bool is_listed(const char *list, const char *word)
{
    size_t length = strlen(word);
    for (const char *at = list; at; at = strchr(at, ',')) {
        if (*at == ',') at++;
        if (strncmp(at, word, length) == 0 && (at[length] == ',' || at[length] == '\0'))
            return true;
    }
    return false;
}

/* The number of words in a list with commas. */
static inline size_t listed_words(const char *list)
{
    size_t words = 1;
    for (const char *c = list; *c; c++)
        words += *c == ',';
    return words;
}

/* Runs a shell command, which is formatted as by printf; returns its exit status, -1: a signal has ended it. */
__attribute__((format(printf, 1, 2))) static inline int run_shell(const char *format, ...)
{
    char *command;
    va_list arguments;
    va_start(arguments, format);
    if (vasprintf(&command, format, arguments) < 0) fatal("out of memory");
    va_end(arguments);
    int status = system(command);
    free(command);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

/* Opens a file for writing, whose path is formatted as by printf; ends the program when that fails. */
__attribute__((format(printf, 1, 2))) static inline FILE *open_to_write(const char *format, ...)
{
    char path[4096];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(path, sizeof path, format, arguments);
    va_end(arguments);
    FILE *file = fopen(path, "w");
    if (!file) fatal("%s cannot be written: %s", path, strerror(errno));
    return file;
}

/* Closes a file; ends the program when not all of it could be written. */
static inline void close_written(FILE *file)
{
    bool failed = ferror(file) != 0;
    if (fclose(file) != 0 || failed)
        fatal("not all of a file could be written: %s", strerror(errno));
}

#endif
