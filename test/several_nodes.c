/*
 * Ranks that seem to be in containers of their own on one machine; loaded in front of the C library (LD_PRELOAD).
 * SEVERAL_NODES: how many of them, dealt to the ranks in turn. SEVERAL_NODES_NOTE: a file that gets a letter for each
 * time that a rank opens memory which another one shares. SEVERAL_NODES_REFUSED: a rank that is not allowed to.
 */
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

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

static int open_next(const char *path, int flags, mode_t mode)
{
    static int (*next)(const char *, int, ...);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "open");
    return next(path, flags, mode);
}

int open(const char *path, int flags, ...)
{
    const char *note = getenv("SEVERAL_NODES_NOTE");
    char target[64] = "";
    va_list arguments;
    va_start(arguments, flags);
    mode_t mode = flags & O_CREAT ? va_arg(arguments, mode_t) : 0;
    va_end(arguments);
    if (note && strncmp(path, "/proc/", 6) == 0 && readlink(path, target, sizeof target - 1) > 0 &&
        strncmp(target, "/memfd:farm", 11) == 0) {
        const char *rank = getenv("PMI_RANK"), *refused = getenv("SEVERAL_NODES_REFUSED");
        if (rank && refused && strcmp(rank, refused) == 0) {
            errno = EACCES;
            return -1;
        }
        int file = open_next(note, O_WRONLY | O_CREAT | O_APPEND, 0600);
        if (file >= 0 && write(file, "m", 1) == 1) close(file);
    }
    return open_next(path, flags, mode);
}
