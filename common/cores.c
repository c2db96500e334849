#include "common/cores.h"

#include <stdio.h>

unsigned cores_borrow(const int *processes, int count, cpu_set_t *own)
{
    cpu_set_t all, theirs;
    CPU_ZERO(own);
    if (sched_getaffinity(0, sizeof *own, own) != 0) return 1;
    all = *own;
    for (int i = 0; i < count; i++)
        if (sched_getaffinity(processes[i], sizeof theirs, &theirs) == 0)
            CPU_OR(&all, &all, &theirs);
    (void)sched_setaffinity(0, sizeof all, &all);
    /* The system may have granted a part of them (cpusets). */
    if (sched_getaffinity(0, sizeof all, &all) != 0) return 1;
    int cores = CPU_COUNT(&all);
    return (unsigned)(count < cores ? count : cores);
}

void cores_return(const cpu_set_t *own)
{
    if (CPU_COUNT(own) > 0) (void)sched_setaffinity(0, sizeof *own, own);
}

/* Containers have names of their own, but the kernel and its cores in common. */
void berth_find(struct berth *berth)
{
    *berth = (struct berth){0};
    if (sched_getaffinity(0, sizeof berth->cores, &berth->cores) != 0) CPU_ZERO(&berth->cores);
    FILE *file = fopen("/proc/sys/kernel/random/boot_id", "r");
    if (!file) return;
    if (!fgets(berth->machine, sizeof berth->machine, file)) berth->machine[0] = '\0';
    fclose(file);
}
