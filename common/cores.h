/* The cores that the processes of a node may run on. While the others have nothing to do, or hardly
 * anything, the first one may use all of them. */
#ifndef FARM_COMMON_CORES_H
#define FARM_COMMON_CORES_H

#include <sched.h>
#include <stddef.h>

/* However many there may be on the machine. */
struct core_set {
    cpu_set_t *cores; /* owned; NULL: unknown */
    size_t bytes;
};

/*
 * Lets the calling thread, and those that it starts from now on, run wherever one of the processes (of
 * this machine, by their pids) may; returns for how many threads there is room: one for each process
 * at most, and one to a core. *own: for cores_return(), which frees it. What the system does not tell or
 * grant leaves the thread where it is.
 */
unsigned cores_borrow(const int *processes, int count, struct core_set *own);
void cores_return(struct core_set *own);

/* Where a process may run. */
struct berth {
    char machine[40]; /* as long as this runs, no other one says the same; empty: unknown */
    cpu_set_t cores;  /* none: unknown, or some beyond the first CPU_SETSIZE of the machine */
};
void berth_find(struct berth *berth);

/* It is the first thing that ranks tell each other, before they can find out that they are of different
 * builds: its size stays. */
_Static_assert(sizeof(struct berth) == 168, "struct berth goes over the wire as it is");

#endif
