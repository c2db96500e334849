#include "common/cpu_time.h"

#include "common/clock.h"
#include "common/extremes.h"

/*
 * The wall clock is read after the CPU clock: the scheduler often preempts a thread when it returns from a
 * system call, and that delay belongs to the time before the piece.
 */
static void read_clocks(struct cpu_time *time)
{
    time->cpu = clock_thread_cpu();
    time->read = clock_wall();
    time->returned = 0;
}

double cpu_time_begin(struct cpu_time *time)
{
    time->begun = clock_wall();
    if (time->begun - time->read >= CPU_TIME_SHORT) {
        read_clocks(time);
        time->begun = time->read;
    }
    return time->begun;
}

double cpu_time_end(struct cpu_time *time, double *ended)
{
    const struct cpu_time earlier = *time;
    *ended = clock_wall();
    if (*ended - earlier.read < CPU_TIME_SHORT) {
        time->returned += *ended - time->begun;
        return *ended - time->begun;
    }
    read_clocks(time);
    *ended = time->read;
    double wall = *ended - time->begun, cpu = time->cpu - earlier.cpu - earlier.returned;
    return wall < CPU_TIME_SHORT ? wall : larger_number(smaller_number(cpu, wall), 0);
}
