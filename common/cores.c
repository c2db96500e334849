#include "common/cores.h"

#include <errno.h>
#include <stdio.h>
#include <string.h>

/* Sets of this size or larger are not tried: Linux supports at most 8192 cores. */
#define TOO_MANY (CPU_SETSIZE << 10)

static void free_cores(struct core_set *set)
{
    if (set->cores) CPU_FREE(set->cores);
    *set = (struct core_set){NULL, 0};
}

/*
 * The affinity of a process, or of the calling thread if process is 0. sched_getaffinity() fails with EINVAL
 * if the set is smaller than the number of cores that the machine may ever have, so the size is doubled until
 * it succeeds.
 */
static struct core_set cores_of(int process)
{
    int refused = EINVAL;
    for (int room = CPU_SETSIZE; room < TOO_MANY && refused == EINVAL; room *= 2) {
        struct core_set set = {CPU_ALLOC((size_t)room), CPU_ALLOC_SIZE((size_t)room)};
        if (!set.cores) break;
        if (sched_getaffinity(process, set.bytes, set.cores) == 0) return set;
        refused = errno;
        free_cores(&set);
    }
    return (struct core_set){NULL, 0};
}

static void add_cores(struct core_set *all, int process)
{
    struct core_set theirs = cores_of(process);
    if (theirs.bytes == all->bytes) CPU_OR_S(all->bytes, all->cores, all->cores, theirs.cores);
    free_cores(&theirs);
}

unsigned cores_borrow(const int *processes, int count, struct core_set *own)
{
    struct core_set all = cores_of(0);
    *own = cores_of(0);
    if (!all.cores) return 1;
    for (int i = 0; i < count; i++)
        add_cores(&all, processes[i]);
    (void)sched_setaffinity(0, all.bytes, all.cores);
    free_cores(&all);
    /* With cpusets the system may have granted only a part of them. */
    all = cores_of(0);
    int cores = all.cores ? CPU_COUNT_S(all.bytes, all.cores) : 1;
    free_cores(&all);
    return (unsigned)(count < cores ? count : cores);
}

void cores_return(struct core_set *own)
{
    if (own->cores) (void)sched_setaffinity(0, own->bytes, own->cores);
    free_cores(own);
}

static void find_cores(cpu_set_t *cores)
{
    struct core_set all = cores_of(0);
    CPU_ZERO(cores);
    if (all.cores && CPU_COUNT_S(all.bytes, all.cores) == CPU_COUNT_S(sizeof *cores, all.cores))
        memcpy(cores, all.cores, sizeof *cores);
    free_cores(&all);
}

/* The boot id, because containers have host names of their own but share the kernel and its cores. */
void affinity_find(struct affinity *affinity)
{
    *affinity = (struct affinity){0};
    find_cores(&affinity->cores);
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "re");
    if (!file) return;
    if (!fgets(affinity->machine, sizeof affinity->machine, file)) affinity->machine[0] = '\0';
    fclose(file);
}
