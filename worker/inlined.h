/* Functions that are compiled into each of their callers, for what is constant there. */
#ifndef FARM_WORKER_INLINED_H
#define FARM_WORKER_INLINED_H

#define INLINED inline __attribute__((always_inline))

#endif
