/*
 * CPU seconds of the pieces of work that a thread does one after the other.
 *
 * To read a thread's CPU clock is a call into the system: 0.6 us in a virtual machine, and as much again where
 * the caches have forgotten what it needs; twice for each tile of 50 us it takes a twentieth of a renderer. But
 * a thread that loses its core loses it for thousandths of a second, so what was done in CPU_TIME_SHORT by the
 * wall clock, which is cheap to read, had it all the time but for trifles. So the clock is read at the end of a
 * piece when it was not for so long.
 */
#ifndef FARM_COMMON_CPU_TIME_H
#define FARM_COMMON_CPU_TIME_H

/* Seconds: a reading for each takes hundredths of them. By so much at most a piece is told wrong. */
#define CPU_TIME_SHORT 100e-6

/* Of one thread; by wall clock but for cpu. Zero: nothing was read yet. */
struct cpu_time {
    double read, cpu; /* both clocks when they were read last */
    double told;      /* of the pieces since then */
    double begun;     /* the piece in work */
};

/* A piece of work begins, behind whatever the thread has done or waited for; returns when, on clock_wall(). The
 * last piece need not have been ended. */
double cpu_time_begin(struct cpu_time *time);

/* The piece is done: returns its CPU seconds, at most those by wall clock, and when it ended to *ended. */
double cpu_time_end(struct cpu_time *time, double *ended);

#endif
