/* How much memory there is to ask for. */
#ifndef FARM_COMMON_MEMORY_H
#define FARM_COMMON_MEMORY_H

#include <stdbool.h>
#include <stddef.h>

/*
 * Bytes: the least of what the machine has, what its control group and what ulimit -v allow. Linux
 * grants more than that and ends the process later, without a word, when the memory is used.
 */
size_t memory_limit(void);

/* Whether a block of so many bytes can exist; small ones are not looked into. */
bool memory_holds(size_t bytes);

#endif
