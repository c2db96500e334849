/*
 * Simulates a slow disk; loaded before the C library (LD_PRELOAD). Every write at an offset of a file takes 20
 * ms longer, syncing a file 300 ms.
 */
#include <dlfcn.h>
#include <sys/types.h>
#include <unistd.h>

ssize_t pwrite(int file, const void *bytes, size_t count, off_t offset)
{
    ssize_t (*next)(int, const void *, size_t, off_t);
    *(void **)&next = dlsym(RTLD_NEXT, "pwrite");
    usleep(20000);
    return next(file, bytes, count, offset);
}

static int sync_slowly(int file, const char *name)
{
    int (*next)(int);
    *(void **)&next = dlsym(RTLD_NEXT, name);
    usleep(300000);
    return next(file);
}

int fsync(int file)
{
    return sync_slowly(file, "fsync");
}

int fdatasync(int file)
{
    return sync_slowly(file, "fdatasync");
}
