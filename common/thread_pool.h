/* A thread pool that runs the iterations of a loop in parallel: for what is done while all the renderers of a node
 * wait for it. Between loops its threads sleep. */
#ifndef FARM_COMMON_THREAD_POOL_H
#define FARM_COMMON_THREAD_POOL_H

#include <stdint.h>

struct thread_pool;

/*
 * Creates a pool of the given number of threads, at least 1, one of which is the caller. There are fewer if the system
 * grants fewer. The caller owns the pool and ends it with thread_pool_destroy().
 */
struct thread_pool *thread_pool_create(unsigned threads);

/* Ends the threads and frees the pool; no loop may be running. */
void thread_pool_destroy(struct thread_pool *pool);

/* Number of threads, the caller included. pool NULL: 1. */
unsigned thread_pool_size(const struct thread_pool *pool);

/* The body of a loop. Iterations of one loop must not depend on each other. */
typedef void thread_pool_body(void *context, uint32_t iteration);

/*
 * Runs the iterations 0 .. count - 1 in any order and returns when all are done. pool NULL: the caller runs them all.
 * Must not be called from an iteration of the same pool, nor by two threads at a time.
 */
void thread_pool_for(struct thread_pool *pool, uint32_t count, thread_pool_body *body,
                     void *context);

/* CPU seconds that the threads other than the caller have spent so far. pool NULL: 0. */
double thread_pool_cpu_s(struct thread_pool *pool);

#endif
