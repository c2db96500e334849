#include "common/memory.h"

#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/resource.h>
#include <unistd.h>

/* The limit of the own control group (version 2) as a container sees it. "max" or a missing file means no
 * limit. */
static size_t group_limit(void)
{
    char text[32] = "";
    FILE *file = fopen("/sys/fs/cgroup/memory.max", "re");
    if (!file) return SIZE_MAX;
    bool found = fgets(text, sizeof text, file) && text[0] >= '0' && text[0] <= '9';
    fclose(file);
    return found ? strtoull(text, NULL, 10) : SIZE_MAX;
}

static size_t machine_limit(void)
{
    long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? (size_t)pages * (size_t)page : SIZE_MAX;
}

static size_t process_limit(void)
{
    struct rlimit limit;
    if (getrlimit(RLIMIT_AS, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return SIZE_MAX;
    return (size_t)limit.rlim_cur;
}

/* Bytes. For smaller blocks the check costs more than it can save. */
#define LARGE_BLOCK ((size_t)64 << 20)

size_t memory_limit(void)
{
    size_t limits[] = {group_limit(), machine_limit(), process_limit()}, least = SIZE_MAX;
    for (size_t i = 0; i < sizeof limits / sizeof *limits; i++)
        if (limits[i] < least) least = limits[i];
    return least;
}

bool memory_holds(size_t bytes)
{
    return bytes < LARGE_BLOCK || bytes <= memory_limit();
}
