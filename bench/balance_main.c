/*
 * make bench-balance: how evenly the work is shared out, in real runs and in virtual time.
 *
 *   balance [--only SECTION[,SECTION...] [--fresh]] [--rounds N]
 *   balance --scene FILE [--samples N] [--rounds N]
 *
 * Sections that are not run again keep what they said the last time; --fresh forgets all of it, the measured
 * costs, too, as a run of all sections does. --scene tells of another scene how it would be shared out, in virtual
 * time, and nothing else. --rounds: how often every tile is timed for its cost (3). Exit status 1: a picture of many
 * ranks was another one than that of one.
 */
#include <stdlib.h>
#include <string.h>

#include "bench/balance.h"
#include "common/message.h"
#include "common/number.h"

static const struct section {
    const char *name;
    void (*run)(void);
} sections[] = {
    {"messages", section_messages}, {"costs", section_costs}, {"figures", section_figures},
    {"static", section_static},     {"real", section_real},   {"model", section_model},
    {"plan", section_plan},         {"marks", section_marks},
};

#define SECTIONS (sizeof sections / sizeof *sections)

/* Whether name is one of the words of a list with commas. */
static bool is_listed(const char *list, const char *name)
{
    size_t length = strlen(name);
    for (const char *at = list; at; at = strchr(at, ',')) {
        if (*at == ',') at++;
        if (strncmp(at, name, length) == 0 && (at[length] == ',' || at[length] == '\0'))
            return true;
    }
    return false;
}

static bool all_known(const char *list)
{
    size_t words = 1, known = 0;
    for (const char *c = list; *c; c++)
        words += *c == ',';
    for (size_t i = 0; i < SECTIONS; i++)
        known += is_listed(list, sections[i].name);
    return known == words;
}

static bool is_count(const char *text, uint32_t *count)
{
    return number_parse_unsigned(text, count) && *count > 0;
}

static void run_sections(const char *only)
{
    for (size_t i = 0; i < SECTIONS; i++) {
        /* The marks follow from all the others. */
        bool last = i + 1 == SECTIONS;
        if (only && !last && !is_listed(only, sections[i].name)) continue;
        fprintf(stderr, "%s\n", sections[i].name);
        sections[i].run();
        values_write();
    }
    join_report();
}

static void forget_all(void)
{
    if (system("rm -f " KEPT_FOLDER "/*") != 0) fatal("cannot empty " KEPT_FOLDER);
}

/* Where they were compared. */
static bool pictures_are_same(void)
{
    bool same = true;
    for (unsigned s = 0; s < SCENES; s++)
        for (unsigned ranks = 2; ranks <= PAPER_PROCESSORS; ranks += PAPER_PROCESSORS - 2)
            same = same && value_get("%s.real.same.%u", bench_scenes[s].name, ranks) != 0;
    return same;
}

int main(int argc, char **argv)
{
    const char *only = NULL, *scene = NULL;
    bool fresh = false;
    uint32_t samples = 1;
    if (system("mkdir -p " OUT_FOLDER " " KEPT_FOLDER) != 0) fatal("cannot make " OUT_FOLDER);
    for (int i = 1; i < argc; i++) {
        if (strcmp(argv[i], "--only") == 0 && i + 1 < argc && all_known(argv[i + 1]))
            only = argv[++i];
        else if (strcmp(argv[i], "--fresh") == 0)
            fresh = true;
        else if (strcmp(argv[i], "--scene") == 0 && i + 1 < argc)
            scene = argv[++i];
        else if (strcmp(argv[i], "--samples") == 0 && i + 1 < argc &&
                 is_count(argv[i + 1], &samples))
            i++;
        else if (strcmp(argv[i], "--rounds") == 0 && i + 1 < argc &&
                 is_count(argv[i + 1], &bench_rounds))
            i++;
        else
            fatal("usage: balance [--rounds N] [--scene FILE [--samples N]] [--fresh] [--only "
                  "messages,costs,figures,static,real,model,plan,marks]");
    }
    if (scene && (only || fresh)) fatal("--scene is no section, and forgets nothing");
    if (scene) {
        values_read();
        compare_schedules(scene, samples);
        values_write();
        return 0;
    }
    if (fresh || !only) forget_all();
    values_read();
    run_sections(only);
    return pictures_are_same() ? 0 : 1;
}
