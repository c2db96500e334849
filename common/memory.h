/* The memory that this process can get. */
#ifndef FARM_COMMON_MEMORY_H
#define FARM_COMMON_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/*
 * The smallest of three limits, in bytes: the physical memory of the machine, the limit of the control group,
 * and that of ulimit -v. Linux grants larger requests, but kills the process without a message when the
 * memory is used.
 */
size_t memory_limit(void);

/* Whether a block of this size fits into memory_limit(). Blocks below 64 MiB are not checked. */
bool memory_holds(size_t bytes);

#endif
