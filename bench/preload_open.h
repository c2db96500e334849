/* For libraries that are loaded before the C library (LD_PRELOAD) and replace open(). */
#ifndef FARM_BENCH_PRELOAD_OPEN_H
#define FARM_BENCH_PRELOAD_OPEN_H

#include <dlfcn.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdbool.h>
#include <string.h>
#include <unistd.h>

/* Calls open() of the C library; arguments: those of open() after its flags. */
static int open_next(const char *path, int flags, va_list arguments)
{
    static int (*next)(const char *, int, ...);
    if (!next) *(void **)&next = dlsym(RTLD_NEXT, "open");
    return next(path, flags, (flags & O_CREAT) ? va_arg(arguments, mode_t) : 0);
}

/* Whether the path is memory that a rank of the farm shares (worker/segment.h). */
static bool is_segment(const char *path)
{
    char target[64] = "";
    return strncmp(path, "/proc/", strlen("/proc/")) == 0 &&
           readlink(path, target, sizeof target - 1) > 0 &&
           strncmp(target, "/memfd:farm", strlen("/memfd:farm")) == 0;
}

#endif
