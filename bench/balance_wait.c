/* Measures how much of a core a waiting rank uses. It is sampled while the rank waits, so that the start, in
 * which MPI spins, does not count. */
#include <dirent.h>
#include <pthread.h>
#include <stdatomic.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/balance.h"
#include "bench/balance_run.h"
#include "bench/median.h"
#include "common/clock.h"
#include "common/message.h"

/* Seconds between samples: many sleeps of a rank that waits. */
#define LOOK_EVERY 1.0

/* Parts of a core: above RENDERS a rank counts as rendering, below WAITS as waiting, between them as starting or
 * ending. */
#define RENDERS 0.5
#define WAITS   0.1

#define RANKS_MAX 16
#define LOOKS_MAX 256

/* A sample: CPU seconds of the processes of a program. */
struct look {
    double time;
    unsigned count;
    long pid[RANKS_MAX];
    double cpu_s[RANKS_MAX];
};

/* CPU seconds of all threads of a process, as counted by Linux's scheduler:
 * Documentation/scheduler/sched-stats.rst. */
static double cpu_of(long pid)
{
    double sum = 0;
    char *folder = format_text("/proc/%ld/task", pid);
    DIR *tasks = opendir(folder);
    for (struct dirent *entry; tasks && (entry = readdir(tasks));) {
        double ns = 0;
        char *name = format_text("%s/%s/schedstat", folder, entry->d_name);
        FILE *file = fopen(name, "r");
        if (file && fscanf(file, "%lf", &ns) == 1) sum += 1e-9 * ns;
        if (file) fclose(file);
        free(name);
    }
    if (tasks) closedir(tasks);
    free(folder);
    return sum;
}

static bool runs_program(long pid, const char *program)
{
    char at[4096], *name = format_text("/proc/%ld/exe", pid);
    ssize_t length = readlink(name, at, sizeof at - 1);
    free(name);
    if (length < 0) return false;
    at[length] = '\0';
    return strcmp(at, program) == 0;
}

static void take_look(struct look *look, const char *program)
{
    DIR *processes = opendir("/proc");
    *look = (struct look){.time = clock_wall()};
    for (struct dirent *entry; processes && (entry = readdir(processes));) {
        long pid = strtol(entry->d_name, NULL, 10);
        if (pid <= 0 || look->count == RANKS_MAX || !runs_program(pid, program)) continue;
        look->pid[look->count] = pid;
        look->cpu_s[look->count++] = cpu_of(pid);
    }
    if (processes) closedir(processes);
}

/* The mean part of a core that waiting ranks used between two samples; -1: it is not the case that exactly one
 * of the ranks renders and all others wait. */
static double share_between(const struct look *a, const struct look *b, unsigned ranks)
{
    unsigned rendering = 0, waiting = 0;
    double sum = 0;
    if (a->count != ranks || memcmp(a->pid, b->pid, sizeof a->pid) != 0) return -1;
    for (unsigned i = 0; i < ranks; i++) {
        double share = (b->cpu_s[i] - a->cpu_s[i]) / (b->time - a->time);
        rendering += share > RENDERS;
        if (share < 0 || share >= WAITS) continue; /* below 0: a thread has ended */
        waiting++;
        sum += share;
    }
    return rendering == 1 && waiting == ranks - 1 ? sum / waiting : -1;
}

struct waiting_run {
    unsigned ranks;
    const char *config, *picture, *options;
    atomic_bool done;
};

static void *run_farm(void *argument)
{
    struct waiting_run *it = argument;
    (void)farm_run(it->ranks, it->config, it->picture, "%s", it->options);
    atomic_store(&it->done, true);
    return NULL;
}

double measure_waiting(unsigned ranks, const char *config, const char *picture, const char *options,
                       unsigned *looks)
{
    static struct look seen[2];
    double shares[LOOKS_MAX];
    struct waiting_run run = {ranks, config, picture, options, false};
    char *program = realpath(farm_program(), NULL);
    pthread_t thread;
    if (!program) fatal("there is no %s", farm_program());
    if (pthread_create(&thread, NULL, run_farm, &run) != 0) fatal("cannot start a thread");
    *looks = 0;
    take_look(&seen[0], program);
    for (unsigned turn = 1; !atomic_load(&run.done); turn++) {
        clock_sleep(LOOK_EVERY);
        take_look(&seen[turn % 2], program);
        double share = share_between(&seen[1 - turn % 2], &seen[turn % 2], ranks);
        if (share >= 0 && *looks < LOOKS_MAX) shares[(*looks)++] = share;
    }
    pthread_join(thread, NULL);
    free(program);
    if (*looks == 0)
        fatal("%u ranks of %s, and no others, were never seen to wait", ranks, farm_program());
    return median_of(shares, *looks);
}
