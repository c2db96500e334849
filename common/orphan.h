/*
 * Ending a rank that is left alone. As a rule the launcher ends a job that has lost a rank; but it may be killed
 * together with rank 0, and then nobody ever tells the other ranks anything.
 */
#ifndef FARM_COMMON_ORPHAN_H
#define FARM_COMMON_ORPHAN_H

#include <semaphore.h>

/* Seconds after which a rank that is left alone no longer waits for what others do at the start and the end: as many as
 * all ranks have to start. */
#define ORPHAN_PATIENCE 300

/* Remembers the process that has started this one; called once, at the start. Until then orphan_leave() does
 * nothing. */
void orphan_watch(void);

/* Ends this rank, as fatal() does, if the process that has started it is gone, and nothing has come for `silence`
 * seconds, more than `patience`. */
void orphan_leave(double silence, double patience);

/* Takes the semaphore, which another process posts. Waits for it, but not longer than orphan_leave() does. */
void orphan_wait(sem_t *posted, double patience);

#endif
