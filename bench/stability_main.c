/* The catalogue of stiff and extreme cases, row by row: see bench/stability.h. */
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#include "bench/outside.h"
#include "bench/pictures.h"
#include "bench/stability.h"
#include "common/clock.h"

/* The catalogue itself has 58 rows. Row 59 compares whole pictures with those of the reference renderer in 448 bits;
 * rows 60 and 61 are about surfaces that touch. */
#define LAST_ROW 61

#define FULL_RAYS  UINT64_C(1000000)
#define FULL_MANY  UINT64_C(100000000)
#define QUICK_RAYS UINT64_C(1500)
#define QUICK_MANY UINT64_C(12000)

static const struct stability_case *const tables[] = {
    sphere_cases,   tangent_cases,  refused_cases, flat_cases,  box_cases,       mesh_cases,
    coplanar_cases, triangle_cases, contact_cases, moved_cases, ray_cases,       tree_cases,
    cone_cases,     light_cases,    bounce_cases,  farm_cases,  reference_cases, touching_cases};

static const char *const verdict_names[] = {"green", "RED", "marked"};

struct options {
    struct budget budget;
    bool chosen[LAST_ROW + 1];
    bool tap;
    struct stage_way way;
    const char *csv, *markdown; /* files to write; NULL: none */
};

static _Noreturn void usage(const char *why)
{
    fprintf(stderr,
            "stability: %s\n"
            "usage: stability [--rays N | --quick] [--rows 1,2,17-25] [--tap]\n"
            "                 [--kernel LEVEL] [--alike N] [--csv FILE] [--markdown FILE]\n",
            why);
    exit(2);
}

static uint64_t parse_count(const char *text, char **end, uint64_t most)
{
    errno = 0;
    double value = strtod(text, end);
    if (*end == text || errno || !(value >= 1) || value > (double)most || value != floor(value))
        usage("expected a whole number in range");
    return (uint64_t)value;
}

static uint64_t whole_count(const char *text, uint64_t most)
{
    char *end;
    uint64_t value = parse_count(text, &end, most);
    if (*end) usage("expected a whole number in range");
    return value;
}

/* "1,2,17-25" */
static void choose_rows(const char *text, bool chosen[LAST_ROW + 1])
{
    memset(chosen, 0, LAST_ROW + 1);
    for (;;) {
        char *end;
        uint64_t first = strtoul(text, &end, 10), last = first;
        if (end != text && *end == '-') last = strtoul(end + 1, &end, 10);
        if (end == text || first < 1 || last > LAST_ROW || first > last)
            usage("expected rows such as 1,2,17-25");
        for (uint64_t row = first; row <= last; row++)
            chosen[row] = true;
        if (*end == '\0') return;
        if (*end != ',') usage("expected rows such as 1,2,17-25");
        text = end + 1;
    }
}

static enum processor_level parse_level(const char *text)
{
    for (enum processor_level level = PROCESSOR_AUTO; level < PROCESSOR_LEVELS; level++) {
        if (strcmp(text, processor_level_names[level]) != 0) continue;
        if (processor_has(processor_resolve(level))) return level;
        usage("this processor lacks that level of the kernel");
    }
    usage("expected auto, portable, avx2 or avx512");
}

static unsigned processors(void)
{
    long count = sysconf(_SC_NPROCESSORS_ONLN);
    return count < 1 ? 1 : (unsigned)count;
}

static struct options parse_options(int argc, char **argv)
{
    struct options options = {
        .budget = {.rays = FULL_RAYS, .many = FULL_MANY, .threads = processors()},
        .way = {PROCESSOR_AUTO, 1}};
    memset(options.chosen, 1, sizeof options.chosen);
    for (int i = 1; i < argc; i++) {
        const char *option = argv[i];
        if (strcmp(option, "--quick") == 0) {
            options.budget.quick = true;
            options.budget.rays = QUICK_RAYS;
            options.budget.many = QUICK_MANY;
            options.budget.threads = 1;
            continue;
        }
        if (strcmp(option, "--tap") == 0) {
            options.tap = true;
            continue;
        }
        const char *value = i + 1 < argc ? argv[++i] : NULL;
        if (!value) usage("unknown option, or a value is missing");
        if (strcmp(option, "--rays") == 0)
            options.budget.rays = options.budget.many = whole_count(value, UINT64_C(1) << 40);
        else if (strcmp(option, "--rows") == 0)
            choose_rows(value, options.chosen);
        else if (strcmp(option, "--kernel") == 0)
            options.way.kernel = parse_level(value);
        else if (strcmp(option, "--alike") == 0)
            options.way.alike = (unsigned)whole_count(value, ALIKE_MAX);
        else if (strcmp(option, "--csv") == 0)
            options.csv = value;
        else if (strcmp(option, "--markdown") == 0)
            options.markdown = value;
        else
            usage("unknown option");
    }
    return options;
}

static const struct stability_case *find_case(int number)
{
    for (size_t i = 0; i < sizeof tables / sizeof *tables; i++) {
        for (const struct stability_case *c = tables[i]; c->number; c++)
            if (c->number == number) return c;
    }
    return NULL;
}

static void run_case(const struct stability_case *c, const struct budget *budget,
                     struct case_result *result)
{
    if (c->run) {
        c->run(budget, result);
        return;
    }
    struct tally tally = {.samples = 0};
    share(budget, c->number, budget->rays, c->work, c->context, &tally);
    conclude(result, &tally, c->unit, c->limit);
}

/* Whether a row that is to be run loads scene files. */
static bool loads_files(const bool chosen[LAST_ROW + 1])
{
    for (int row = 1; row <= LAST_ROW; row++) {
        const struct stability_case *c = find_case(row);
        if (chosen[row] && c && c->files) return true;
    }
    return false;
}

static FILE *open_table(const char *path, const char *head)
{
    if (!path) return NULL;
    FILE *file = open_to_write("%s", path);
    fputs(head, file);
    return file;
}

/* Writes a cell, empty if nothing was measured. */
static void put_cell(FILE *file, bool measured, double value)
{
    if (measured)
        fprintf(file, "%.9g,", value);
    else
        fputc(',', file);
}

static void write_csv(FILE *file, const struct stability_case *c, const struct case_result *result,
                      double seconds)
{
    bool measures = result->unit != NULL, paper = result->paper_samples > 0;
    fprintf(file, "%d,\"%s\",\"%s\",\"%s\",%llu,\"%s\",\"%s\",%.6g,", c->number, c->name, c->oracle,
            c->pass_mark, (unsigned long long)result->samples, result->paper, result->ours,
            result->worst);
    put_cell(file, measures, result->limit);
    put_cell(file, measures && paper, result->paper_worst);
    fprintf(file, "%s,%llu,", measures ? result->unit : "", (unsigned long long)result->wrong);
    put_cell(file, paper, (double)result->paper_wrong);
    put_cell(file, paper, (double)result->paper_samples);
    fprintf(file, "%llu,%s,%.1f,\"%s\"\n", (unsigned long long)result->fallbacks,
            verdict_names[result->verdict], seconds, result->note);
    fflush(file);
}

static void write_markdown(FILE *file, const struct stability_case *c,
                           const struct case_result *result)
{
    fprintf(file, "| %d | %s | %s | %s | %.3g | %s | %s | %s | %s |\n", c->number, c->name,
            c->oracle, c->pass_mark, (double)result->samples, result->paper, result->ours,
            verdict_names[result->verdict], result->note);
    fflush(file);
}

static void print_row(const struct stability_case *c, const struct case_result *result,
                      double seconds, const struct options *options)
{
    const char *verdict = verdict_names[result->verdict];
    const char *note = result->note;
    if (options->tap) {
        const char *ok = result->verdict == VERDICT_RED ? "not ok" : "ok";
        printf("%s %d - %s (kernel = %s, %u alike): %s%s%s%s%s\n", ok, c->number, c->name,
               processor_level_names[options->way.kernel], options->way.alike, result->ours,
               *note ? " (" : "", note, *note ? ")" : "",
               result->verdict == VERDICT_MARKED ? " # marked" : "");
    } else {
        printf("%2d %-6s %-46s %8.3g  paper: %-34s ours: %-30s %6.1f s%s%s\n", c->number, verdict,
               c->name, (double)result->samples, result->paper, result->ours, seconds,
               *note ? "  " : "", note);
    }
    fflush(stdout);
}

int main(int argc, char **argv)
{
    struct options options = parse_options(argc, argv);
    stage_set_way(options.way);
    if (loads_files(options.chosen)) picture_files_check(options.budget.quick);
    FILE *csv = open_table(
        options.csv, "row,case,oracle,pass_mark,samples,paper,ours,worst,limit,paper_worst,unit,"
                     "wrong,paper_wrong,paper_samples,exact_fallbacks,verdict,seconds,note\n");
    FILE *markdown =
        open_table(options.markdown,
                   "| row | case | oracle | pass mark | samples | paper | ours | verdict | note |\n"
                   "|---|---|---|---|---|---|---|---|---|\n");
    unsigned verdicts[3] = {0};
    for (int row = 1; row <= LAST_ROW; row++) {
        const struct stability_case *c = find_case(row);
        if (!options.chosen[row] || !c) continue;
        struct case_result result = {.samples = 0};
        double start = clock_wall();
        run_case(c, &options.budget, &result);
        double seconds = clock_wall() - start;
        verdicts[result.verdict]++;
        print_row(c, &result, seconds, &options);
        if (csv) write_csv(csv, c, &result, seconds);
        if (markdown) write_markdown(markdown, c, &result);
    }
    if (csv) close_written(csv);
    if (markdown) close_written(markdown);
    printf("%s%u green, %u red, %u marked\n", options.tap ? "# " : "", verdicts[VERDICT_GREEN],
           verdicts[VERDICT_RED], verdicts[VERDICT_MARKED]);
    return verdicts[VERDICT_RED] ? 1 : 0;
}
