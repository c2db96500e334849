/*
 * A library for LD_PRELOAD that makes the ranks of one machine appear to be in several containers. SEVERAL_NODES: the
 * number of containers, to which ranks are assigned in turn. SEVERAL_NODES_NOTE: a file to which a letter is appended
 * each time a rank opens memory of another one. SEVERAL_NODES_REFUSED: a rank that is not allowed to open any.
 */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

#include "bench/preload_open.h"

int stat(const char *restrict path, struct stat *restrict status)
{
    static int (*next)(const char *, struct stat *);
    const char *rank = getenv("PMI_RANK"), *nodes = getenv("SEVERAL_NODES");
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "stat");
    int result = next(path, status);
    if (result == 0 && rank && nodes && strcmp(path, "/proc/self/ns/ipc") == 0)
        status->st_ino += (ino_t)(atoi(rank) % atoi(nodes));
    return result;
}

/* Appends a letter to the note; false: this rank is not allowed to open segments. */
static bool may_open_segment(void)
{
    const char *note = getenv("SEVERAL_NODES_NOTE"), *rank = getenv("PMI_RANK");
    const char *refused = getenv("SEVERAL_NODES_REFUSED");
    if (rank && refused && strcmp(rank, refused) == 0) return false;
    FILE *file = note ? fopen(note, "a") : NULL;
    if (file) fputc('m', file);
    if (file) fclose(file);
    return true;
}

int open(const char *path, int flags, ...)
{
    va_list arguments;
    if (is_segment(path) && !may_open_segment()) {
        errno = EACCES;
        return -1;
    }
    va_start(arguments, flags);
    int file = open_next(path, flags, arguments);
    va_end(arguments);
    return file;
}
