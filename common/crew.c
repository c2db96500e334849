#include "common/crew.h"

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stdlib.h>

#include "common/clock.h"
#include "common/message.h"

struct crew {
    pthread_mutex_t lock; /* protects the fields up to cpu_s */
    pthread_cond_t begun, done;
    uint64_t loops;   /* begun so far */
    unsigned working; /* threads that have not yet finished the latest loop */
    bool dismissed;
    double cpu_s; /* spent by the threads, the caller excluded */

    crew_work *work;
    void *context;
    uint32_t count;
    _Atomic uint64_t next; /* the next round; >= count when none is left */

    unsigned threads; /* excluding the caller of crew_gather() */
    pthread_t ids[];
};

static void take_rounds(struct crew *crew)
{
    for (;;) {
        uint64_t round = atomic_fetch_add(&crew->next, 1);
        if (round >= crew->count) return;
        crew->work(crew->context, (uint32_t)round);
    }
}

/* Waits until more than this many loops have begun. Returns false if the crew was dismissed instead. */
static bool wait_for_loop(struct crew *crew, uint64_t loops)
{
    pthread_mutex_lock(&crew->lock);
    while (crew->loops == loops && !crew->dismissed)
        pthread_cond_wait(&crew->begun, &crew->lock);
    bool begun = crew->loops > loops;
    pthread_mutex_unlock(&crew->lock);
    return begun;
}

static void *member(void *argument)
{
    struct crew *crew = argument;
    for (uint64_t loops = 0; wait_for_loop(crew, loops); loops++) {
        double cpu = clock_thread_cpu();
        take_rounds(crew);
        cpu = clock_thread_cpu() - cpu;
        pthread_mutex_lock(&crew->lock);
        crew->cpu_s += cpu;
        if (--crew->working == 0) pthread_cond_signal(&crew->done);
        pthread_mutex_unlock(&crew->lock);
    }
    return NULL;
}

struct crew *crew_gather(unsigned members)
{
    struct crew *crew = allocate_zeroed(1, sizeof *crew + members * sizeof *crew->ids);
    pthread_mutex_init(&crew->lock, NULL);
    pthread_cond_init(&crew->begun, NULL);
    pthread_cond_init(&crew->done, NULL);
    for (; crew->threads + 1 < members; crew->threads++)
        if (pthread_create(&crew->ids[crew->threads], NULL, member, crew) != 0) break;
    return crew;
}

unsigned crew_size(const struct crew *crew)
{
    return crew ? crew->threads + 1 : 1;
}

void crew_dismiss(struct crew *crew)
{
    pthread_mutex_lock(&crew->lock);
    crew->dismissed = true;
    pthread_cond_broadcast(&crew->begun);
    pthread_mutex_unlock(&crew->lock);
    for (unsigned i = 0; i < crew->threads; i++)
        pthread_join(crew->ids[i], NULL);
    pthread_cond_destroy(&crew->done);
    pthread_cond_destroy(&crew->begun);
    pthread_mutex_destroy(&crew->lock);
    free(crew);
}

void crew_share(struct crew *crew, uint32_t count, crew_work *work, void *context)
{
    if (!crew || crew->threads == 0 || count < 2) {
        for (uint32_t round = 0; round < count; round++)
            work(context, round);
        return;
    }
    pthread_mutex_lock(&crew->lock);
    crew->work = work;
    crew->context = context;
    crew->count = count;
    atomic_store(&crew->next, 0);
    crew->loops++;
    crew->working = crew->threads;
    pthread_cond_broadcast(&crew->begun);
    pthread_mutex_unlock(&crew->lock);
    take_rounds(crew);
    pthread_mutex_lock(&crew->lock);
    while (crew->working > 0)
        pthread_cond_wait(&crew->done, &crew->lock);
    pthread_mutex_unlock(&crew->lock);
}

double crew_cpu_s(struct crew *crew)
{
    if (!crew) return 0;
    pthread_mutex_lock(&crew->lock);
    double seconds = crew->cpu_s;
    pthread_mutex_unlock(&crew->lock);
    return seconds;
}
