#include "bench/balance_run.h"

#include <math.h>
#include <sched.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/outside.h"
#include "bench/report_values.h"
#include "common/message.h"

const char *farm_program(void)
{
    return from_environment("FARM", "./farm");
}

/* Each worker is on its own line, which begins with its rank. */
static void read_workers(struct farm_run *run, const char *text)
{
    const char *at = strstr(text, "\"workers\":");
    if (run->renderers > RUN_RANKS) fatal("a run on more than %d ranks", RUN_RANKS);
    for (unsigned i = 0; i < run->renderers; i++) {
        at = at ? strstr(at + 1, "{\"rank\":") : NULL;
        if (!at) fatal("the report has too few workers");
        run->cpu_s[i] = report_number(at, "cpu_s");
    }
}

static struct farm_run read_report(const char *text)
{
    const char *master = strstr(text, "\"master\":");
    if (!master) fatal("the report has no master");
    struct farm_run run = {.total_s = report_number(text, "total_s"),
                           .init_s = report_number(text, "init_s"),
                           .load_s = report_number(text, "load_s"),
                           .broadcast_s = report_number(text, "broadcast_s"),
                           .build_s = report_number(text, "build_s"),
                           .render_s = report_number(text, "render_s"),
                           .write_s = report_number(text, "write_s"),
                           .master_cpu_s = report_number(master, "cpu_s"),
                           .messages = report_number(master, "messages"),
                           .service_s = report_number(master, "service_s"),
                           .tail_s = report_number(text, "tail_s"),
                           .renderers = (unsigned)report_number(text, "renderers")};
    read_workers(&run, text);
    return run;
}

/* The farm's arguments, as text for the shell. */
static char *arguments_of(const char *config, const char *picture, const char *options)
{
    return format_text("%s output.image=%s output.report=%s.json output.journal= %s", config,
                       picture, picture, options);
}

/* A command for the shell. */
static char *command_of(const char *launch, const char *picture)
{
    return format_text("%s %s >%s.log 2>&1", from_environment("MPIEXEC", "mpiexec"), launch,
                       picture);
}

/* Frees the command. */
static void run_command(char *command, const char *picture)
{
    if (run_shell("%s", command) != 0) fatal("failed, see %s.log: %s", picture, command);
    free(command);
}

static struct farm_run read_run(const char *picture)
{
    char *report = format_text("%s.json", picture);
    char *text = report_text(report);
    struct farm_run run = read_report(text);
    free(text);
    free(report);
    return run;
}

static char *farm_command(unsigned ranks, const char *config, const char *picture,
                          const char *options)
{
    char *arguments = arguments_of(config, picture, options);
    char *launch = format_text("-n %u '%s' %s", ranks, farm_program(), arguments);
    char *command = command_of(launch, picture);
    free(launch);
    free(arguments);
    return command;
}

struct farm_run farm_run(unsigned ranks, const char *config, const char *picture,
                         const char *options, ...)
{
    char *text;
    va_list arguments;
    va_start(arguments, options);
    if (vasprintf(&text, options, arguments) < 0) fatal("out of memory");
    va_end(arguments);
    run_command(farm_command(ranks, config, picture, text), picture);
    free(text);
    return read_run(picture);
}

double farm_run_side_by_side(const char *config, const char *picture, const char *options)
{
    char *beside = format_text("%s.beside.pfm", picture);
    char *first = farm_command(1, config, picture, options);
    char *second = farm_command(1, config, beside, options);
    run_command(format_text("{ %s & } ; %s; status=$?; wait $! && exit $status", first, second),
                picture);
    double seconds = (read_run(picture).render_s + read_run(beside).render_s) / 2;
    free(second);
    free(first);
    free(beside);
    return seconds;
}

bool two_processors(unsigned two[2])
{
    cpu_set_t own;
    unsigned found = 0;
    if (sched_getaffinity(0, sizeof own, &own) != 0) return false;
    for (unsigned i = 0; i < CPU_SETSIZE && found < 2; i++)
        if (CPU_ISSET(i, &own)) two[found++] = i;
    return found == 2;
}

struct farm_run farm_run_slow(const char *config, const char *picture, const char *options)
{
    const char *farm = farm_program();
    unsigned two[2];
    if (!two_processors(two)) fatal("a renderer that is slowed wants a processor of its own");
    char *arguments = arguments_of(config, picture, options);
    char *launch =
        format_text("-n 1 taskset -c %u '%s' %s : -n 1 taskset -c %u sh bench/balance_slow.sh "
                    "'%s' %s",
                    two[0], farm, arguments, two[1], farm, arguments);
    run_command(command_of(launch, picture), picture);
    free(launch);
    free(arguments);
    return read_run(picture);
}

double all_cpu(const struct farm_run *run)
{
    double cpu = 0;
    for (unsigned i = 0; i < run->renderers; i++)
        cpu += run->cpu_s[i];
    return cpu;
}

double most_cpu(const struct farm_run *run)
{
    double most = 0;
    for (unsigned i = 0; i < run->renderers; i++)
        most = fmax(most, run->cpu_s[i]);
    return most;
}
