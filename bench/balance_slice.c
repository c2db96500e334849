/* Measures the time slice: how long this system lets a process run while another one waits for its processor.
 * This is for two processes; with more, slices may be shorter. */
#include <sched.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "bench/balance.h"
#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"

/* Seconds of observation; and the least seconds of a pause in which another process had the processor, rather
 * than an interrupt. */
#define SPAN  0.5
#define PAUSE 3e-4

#define TURNS_MAX 512

/* Starts a process that runs until it is killed or its parent has ended. */
static pid_t start_rival(void)
{
    pid_t child = fork();
    if (child < 0) fatal("cannot start a process");
    if (child > 0) return child;
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    for (volatile unsigned i = 0;; i++)
        ;
}

/* Measures the seconds of each turn of this process; returns their number. */
static unsigned watch_turns(double turns[TURNS_MAX])
{
    unsigned count = 0;
    double begin = clock_wall(), end = begin + SPAN, last = begin;
    for (double now = begin; now < end && count < TURNS_MAX; last = now) {
        now = clock_wall();
        if (now - last < PAUSE) continue;
        turns[count++] = last - begin;
        begin = now;
    }
    return count;
}

double measure_slice(void)
{
    static double turns[TURNS_MAX];
    cpu_set_t before, one;
    CPU_ZERO(&one);
    CPU_SET((unsigned)sched_getcpu(), &one);
    if (sched_getaffinity(0, sizeof before, &before) != 0 ||
        sched_setaffinity(0, sizeof one, &one) != 0)
        fatal("cannot keep to one processor");
    pid_t rival = start_rival();
    unsigned count = watch_turns(turns);
    kill(rival, SIGKILL);
    waitpid(rival, NULL, 0);
    sched_setaffinity(0, sizeof before, &before);
    if (count == 0) fatal("two processes on one processor do not take turns");
    return median_of(turns, count);
}
