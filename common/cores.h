/*
 * The cores that the processes of a node may run on (CPU affinity). While the other processes are idle or
 * nearly so, the first one may use the cores of all of them.
 */
#ifndef FARM_COMMON_CORES_H
#define FARM_COMMON_CORES_H

#include <sched.h>
#include <stddef.h>

/* A CPU set of any size, for machines with more than CPU_SETSIZE cores. */
struct core_set {
    cpu_set_t *cores; /* owned; NULL: unknown */
    size_t bytes;
};

/*
 * Extends the affinity of the calling thread, and of threads that it starts afterwards, to the cores of all
 * the given processes (process ids on this machine). Returns the number of threads worth running: at most one
 * per process and one per core. *own receives the former affinity, for cores_return(), which restores and
 * frees it. If the system refuses to tell or to set an affinity, the thread stays where it is.
 */
unsigned cores_borrow(const int *processes, int count, struct core_set *own);
void cores_return(struct core_set *own);

/* Where a process may run: its machine and cores. */
struct affinity {
    char machine[40]; /* boot id, unique among running machines; empty: unknown */
    cpu_set_t cores;  /* empty: unknown, or cores beyond the first CPU_SETSIZE are among them */
};

/* Fills in that of the calling process; what the system does not tell is left unknown. */
void affinity_find(struct affinity *affinity);

/* Ranks exchange this first, before they can find out that they are different builds: its size must never
 * change. */
_Static_assert(sizeof(struct affinity) == 168, "struct affinity goes over the wire as it is");

#endif
