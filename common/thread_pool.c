#include "common/thread_pool.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"

struct thread_pool {
    pthread_mutex_t lock; /* protects the fields up to cpu_s */
    pthread_cond_t begun, done;
    uint64_t loops;   /* begun so far */
    unsigned working; /* threads that have not yet finished the latest loop */
    bool ending;
    double cpu_s; /* spent by the threads, the caller excluded */

    thread_pool_body *body;
    void *context;
    uint32_t count;
    _Atomic uint64_t next; /* the next iteration; >= count when none is left */

    unsigned threads; /* excluding the caller of thread_pool_create() */
    pthread_t ids[];
};

static void run_iterations(struct thread_pool *pool)
{
    for (;;) {
        uint64_t iteration = atomic_fetch_add(&pool->next, 1);
        if (iteration >= pool->count) return;
        pool->body(pool->context, (uint32_t)iteration);
    }
}

/* Waits until more than this many loops have begun. Returns false if the pool is ending instead. */
static bool wait_for_loop(struct thread_pool *pool, uint64_t loops)
{
    pthread_mutex_lock(&pool->lock);
    while (pool->loops == loops && !pool->ending)
        pthread_cond_wait(&pool->begun, &pool->lock);
    bool begun = pool->loops > loops;
    pthread_mutex_unlock(&pool->lock);
    return begun;
}

static void *pool_thread(void *argument)
{
    struct thread_pool *pool = argument;
    for (uint64_t loops = 0; wait_for_loop(pool, loops); loops++) {
        double cpu = clock_thread_cpu();
        run_iterations(pool);
        cpu = clock_thread_cpu() - cpu;
        pthread_mutex_lock(&pool->lock);
        pool->cpu_s += cpu;
        if (--pool->working == 0) pthread_cond_signal(&pool->done);
        pthread_mutex_unlock(&pool->lock);
    }
    return NULL;
}

struct thread_pool *thread_pool_create(unsigned threads)
{
    struct thread_pool *pool = allocate_zeroed(1, sizeof *pool + threads * sizeof *pool->ids);
    pthread_mutex_init(&pool->lock, NULL);
    pthread_cond_init(&pool->begun, NULL);
    pthread_cond_init(&pool->done, NULL);
    for (; pool->threads + 1 < threads; pool->threads++)
        if (pthread_create(&pool->ids[pool->threads], NULL, pool_thread, pool) != 0) break;
    return pool;
}

unsigned thread_pool_size(const struct thread_pool *pool)
{
    return pool ? pool->threads + 1 : 1;
}

void thread_pool_destroy(struct thread_pool *pool)
{
    pthread_mutex_lock(&pool->lock);
    pool->ending = true;
    pthread_cond_broadcast(&pool->begun);
    pthread_mutex_unlock(&pool->lock);
    for (unsigned i = 0; i < pool->threads; i++)
        pthread_join(pool->ids[i], NULL);
    pthread_cond_destroy(&pool->done);
    pthread_cond_destroy(&pool->begun);
    pthread_mutex_destroy(&pool->lock);
    free(pool);
}

void thread_pool_for(struct thread_pool *pool, uint32_t count, thread_pool_body *body,
                     void *context)
{
    if (!pool || pool->threads == 0 || count < 2) {
        for (uint32_t iteration = 0; iteration < count; iteration++)
            body(context, iteration);
        return;
    }
    pthread_mutex_lock(&pool->lock);
    pool->body = body;
    pool->context = context;
    pool->count = count;
    atomic_store(&pool->next, 0);
    pool->loops++;
    pool->working = pool->threads;
    pthread_cond_broadcast(&pool->begun);
    pthread_mutex_unlock(&pool->lock);
    run_iterations(pool);
    pthread_mutex_lock(&pool->lock);
    while (pool->working > 0)
        pthread_cond_wait(&pool->done, &pool->lock);
    pthread_mutex_unlock(&pool->lock);
}

double thread_pool_cpu_s(struct thread_pool *pool)
{
    if (!pool) return 0;
    pthread_mutex_lock(&pool->lock);
    double seconds = pool->cpu_s;
    pthread_mutex_unlock(&pool->lock);
    return seconds;
}
