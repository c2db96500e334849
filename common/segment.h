/* Memory that processes of one machine share. */
#ifndef FARM_COMMON_SEGMENT_H
#define FARM_COMMON_SEGMENT_H

#include <stddef.h>
#include <stdint.h>

/* Processes for which it is the same can open each other's segments, and know each other by the same process
 * ids; 0: unknown, and none can. */
uint64_t segment_reach(void);

/* The name of a segment: different ones for all callers. */
uint64_t segment_key(void);

/*
 * A new segment, all zero, of so many bytes (at least 1), at a multiple of the page size; ends the program if there is
 * no room for it. It has a name until segment_forget(), and lasts until the last process that has opened it has
 * closed it or ended. One at a time has a name.
 */
void *segment_create(uint64_t key, size_t bytes);

/* Of another process, as long as it has its name; *bytes: its size. Ends the program if there is none. */
void *segment_open(uint64_t key, size_t *bytes);

/* By the one who has created it, when all have opened it: from then on nothing is left, however they end. Also by
 * one who ends before that, in a signal handler, too; where there is none this does nothing. */
void segment_forget(void);

void segment_close(void *segment, size_t bytes);

#endif
