#include "bench/command.h"

#include <errno.h>
#include <fcntl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "common/clock.h"
#include "common/message.h"

void command_add(struct command *command, const char *format, ...)
{
    va_list arguments;
    if (command->count == COMMAND_WORDS) fatal("a command has too many words");
    va_start(arguments, format);
    if (vasprintf(&command->words[command->count++], format, arguments) < 0) fatal("out of memory");
    va_end(arguments);
}

static _Noreturn void become(const struct command *command, const char *log)
{
    int file = open(log, O_WRONLY | O_CREAT | O_TRUNC, 0666);
    if (file < 0) _exit(126);
    dup2(file, STDOUT_FILENO);
    dup2(file, STDERR_FILENO);
    execvp(command->words[0], command->words);
    fprintf(stderr, "%s: %s\n", command->words[0], strerror(errno));
    _exit(127);
}

static double seconds(struct timeval time)
{
    return (double)time.tv_sec + 1e-6 * (double)time.tv_usec;
}

bool command_run(struct command *command, const char *log, struct usage *usage)
{
    struct rusage used;
    int status;
    fflush(NULL);
    double start = clock_wall();
    pid_t child = fork();
    if (child < 0) fatal("no process can be started: %s", strerror(errno));
    if (child == 0) become(command, log);
    while (wait4(child, &status, 0, &used) < 0)
        if (errno != EINTR) fatal("a process is lost: %s", strerror(errno));
    *usage = (struct usage){.wall_s = clock_wall() - start,
                            .cpu_s = seconds(used.ru_utime) + seconds(used.ru_stime),
                            .resident_kib = (double)used.ru_maxrss};
    bool good = WIFEXITED(status) && WEXITSTATUS(status) == 0;
    if (!good) fprintf(stderr, "%s ended badly; what it said is in %s\n", command->words[0], log);
    for (unsigned i = 0; i < command->count; i++)
        free(command->words[i]);
    return good;
}
