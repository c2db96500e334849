/* Programs that benches run and measure, without a shell. */
#ifndef FARM_BENCH_COMMAND_H
#define FARM_BENCH_COMMAND_H

#include <stdbool.h>

#define COMMAND_WORDS 24

struct command {
    char *words[COMMAND_WORDS + 1]; /* NULL at the end; owned */
    unsigned count;
};

/* What a process took, with all of its threads. */
struct usage {
    double wall_s, cpu_s;
    double resident_kib; /* its largest resident set */
};

/* Adds a word, which is formatted as by printf. */
void command_add(struct command *command, const char *format, ...)
    __attribute__((format(printf, 2, 3)));

/* Runs the command, with its output in the file `log`, and frees it. Returns whether it ended with status 0; says so on
 * stderr otherwise. */
bool command_run(struct command *command, const char *log, struct usage *usage);

#endif
