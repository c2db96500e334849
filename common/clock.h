/* Clocks of the report, read in seconds, and sleeping. */
#ifndef FARM_COMMON_CLOCK_H
#define FARM_COMMON_CLOCK_H

#include <time.h>

static inline double clock_read(clockid_t id)
{
    struct timespec now;
    clock_gettime(id, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

/* Wall seconds since some fixed moment; never runs backwards. */
static inline double clock_wall(void)
{
    return clock_read(CLOCK_MONOTONIC);
}

/* CPU seconds of the calling thread. */
static inline double clock_thread_cpu(void)
{
    return clock_read(CLOCK_THREAD_CPUTIME_ID);
}

/* Converts seconds, which must not be negative, to a struct timespec. */
static inline struct timespec clock_span(double seconds)
{
    return (struct timespec){.tv_sec = (time_t)seconds,
                             .tv_nsec = (long)(1e9 * (seconds - (double)(time_t)seconds))};
}

static inline void clock_sleep(double seconds)
{
    struct timespec span = clock_span(seconds);
    nanosleep(&span, NULL);
}

#endif
