/*
 * CPU time of consecutive pieces of work of one thread, with few reads of its CPU clock.
 *
 * Reading a thread's CPU clock takes a system call: 0.6 us in a virtual machine, and as much again if the
 * caches have lost what it needs. Two reads for each tile of 50 us would take a twentieth of a renderer's
 * time. But a thread that loses its core loses it for milliseconds. A piece shorter than CPU_TIME_SHORT by
 * the wall clock, which is cheap to read, has therefore had its core all the time, to a good approximation,
 * and its wall time is its CPU time. The CPU clock is read at the end of a piece only if the last reading is
 * older than that.
 */
#ifndef FARM_COMMON_CPU_TIME_H
#define FARM_COMMON_CPU_TIME_H

/* Seconds. One reading per such interval costs a hundredth of the time or so. The error of a piece is at most
 * this. */
#define CPU_TIME_SHORT 100e-6

/* The state of one thread; zero-initialised: no clock was read yet. All but cpu are wall times, in seconds. */
struct cpu_time {
    double read, cpu; /* wall and CPU clock at the last reading of the latter */
    double returned;  /* sum of the times returned for pieces since then */
    double begun;     /* start of the current piece */
};

/*
 * Begins a piece of work, after anything else the thread has done or waited for. Returns the start time on
 * clock_wall(). The preceding piece need not have been ended.
 */
double cpu_time_begin(struct cpu_time *time);

/* Ends the piece. Returns its CPU seconds, at most its wall seconds; *ended receives the end time on
 * clock_wall(). */
double cpu_time_end(struct cpu_time *time, double *ended);

#endif
