/* The sections of the report: each is kept in a file of its own, so that they can be made apart. */
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "bench/balance.h"
#include "bench/outside.h"
#include "common/message.h"

/* In the order in which they are made: "static" says what "figures" has simulated, the marks follow from all
 * the others. */
static const struct section {
    const char *name, *what, *heading;
    void (*make)(FILE *out);
} sections[] = {
    {"messages", "what a message costs between two ranks", "What a message costs",
     section_messages},
    {"costs", "what each tile costs", "What a tile costs", section_costs},
    {"figures", "the paper's figures 10 to 13, simulated", "The paper's figures 10 to 13",
     section_figures},
    {"static", "fixed shares in real runs on up to 44 ranks, by CPU time",
     "Static shares, real runs", section_static},
    {"real", "real runs on one, two and 44 ranks, and with a slow renderer", "Real runs",
     section_real},
    {"model", "the simulated farm against real runs", "The simulated farm against the real one",
     section_model},
    {"adaptive", "adaptive runs, simulated on up to 44 processors", "Adaptive runs",
     section_adaptive},
    {"plan", "farms of up to 100,000 renderers, simulated", "Farms that are not here",
     section_plan},
    {"marks", "what is asked for, and whether it was reached (always made)", "The marks",
     section_marks},
};

#define SECTIONS (sizeof sections / sizeof *sections)

/* The report begins with the last one, the marks, and ends with these first ones, which the others are made of. */
#define INGREDIENTS 2

bool sections_known(const char *list)
{
    size_t known = 0;
    for (size_t i = 0; i < SECTIONS; i++)
        known += is_listed(list, sections[i].name);
    return known == listed_words(list);
}

void sections_list(FILE *out)
{
    for (size_t i = 0; i < SECTIONS; i++)
        fprintf(out, "  %-11s  %s\n", sections[i].name, sections[i].what);
}

/* Takes the place of the section that was made earlier once it is whole. */
static void make_section(const struct section *section)
{
    char when[32];
    time_t now = time(NULL);
    strftime(when, sizeof when, "%Y-%m-%d %H:%M", localtime(&now));
    char *part = format_text(KEPT_FOLDER "/%s.part", section->name);
    char *whole = format_text(KEPT_FOLDER "/%s.md", section->name);
    FILE *out = open_to_write("%s", part);
    fprintf(out, "## %s\n\n<!-- BALANCE_OPTIONS=\"--only %s\", %s -->\n\n", section->heading,
            section->name, when);
    section->make(out);
    close_written(out);
    if (rename(part, whole) != 0) fatal("cannot write %s: %s", whole, strerror(errno));
    free(whole);
    free(part);
}

static void put_section(FILE *out, const struct section *section)
{
    char path[256], text[4096];
    size_t bytes;
    snprintf(path, sizeof path, KEPT_FOLDER "/%s.md", section->name);
    FILE *file = fopen(path, "r");
    if (!file) return;
    while ((bytes = fread(text, 1, sizeof text, file)) > 0)
        fwrite(text, 1, bytes, out);
    fputc('\n', out);
    fclose(file);
}

static void put_report(void)
{
    FILE *out = open_to_write(OUT_FOLDER "/balance.md");
    fprintf(out, "# Balance\n\n");
    put_section(out, &sections[SECTIONS - 1]);
    for (size_t i = INGREDIENTS; i < SECTIONS - 1; i++)
        put_section(out, &sections[i]);
    for (size_t i = 0; i < INGREDIENTS; i++)
        put_section(out, &sections[i]);
    close_written(out);
}

void sections_run(const char *list)
{
    for (size_t i = 0; i < SECTIONS; i++) {
        bool last = i + 1 == SECTIONS;
        if (list && !last && !is_listed(list, sections[i].name)) continue;
        fprintf(stderr, "%s\n", sections[i].name);
        make_section(&sections[i]);
        values_write();
    }
    put_report();
}
