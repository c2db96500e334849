/*
 * Measures what is saved by leaving out what a scene does not need.
 *
 * Each case is a scene that lacks something. It is rendered by the variant that leaves that out (farm.variant =
 * auto) and by the one that leaves out nothing (full), in turn, and the pictures have to be the same. Times are
 * CPU times of the rendering thread, from the report; memory is the largest resident set of the process; both
 * are medians over the pairs. Time counts as saved when all pairs show it, which happens by chance in one case
 * of 512.
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "bench/command.h"
#include "bench/median.h"
#include "bench/outside.h"
#include "bench/report_values.h"
#include "common/message.h"

#define PAIRS_MAX 99

/* ---- scenes ---- */

/* The contents of a scene. */
struct contents {
    unsigned spheres; /* count */
    unsigned grid;    /* edge of a mesh of 2 grid^2 triangles */
    /* The same for a mesh whose faces are left out: vertices that no face uses. */
    unsigned idle_grid;
    unsigned sides; /* 2: each face of the mesh is added again with the opposite orientation */
    double reflection, transmission, specular, diffuse;
    unsigned lights, black_lights;
    bool shadows;
};

/* What each case lacks, and what its scene has, in the order of struct contents. */
static const struct omission {
    const char *name;
    struct contents contents;
} omissions[] = {
    /* clang-format off */
    /*                                 spheres grid idle sides reflect transm. specular diffuse lights black shadows */
    {"nothing",                           {400,  60,   0,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"triangles",                         {400,   0,   0,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"spheres",                           {  0,  60,   0,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"reflection",                        {400,  60,   0,    1,      0,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"refraction",                        {400,  60,   0,    1,    0.3,      0,     0.4,    0.7,     3,    0,   true}},
    {"reflection and refraction",         {400,  60,   0,    1,      0,      0,     0.4,    0.7,     3,    0,   true}},
    {"shadows",                           {400,  60,   0,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,  false}},
    {"all lights but one",                {400,  60,   0,    1,    0.3,    0.5,     0.4,    0.7,     1,    0,   true}},
    {"the colour of two lights",          {400,  60,   0,    1,    0.3,    0.5,     0.4,    0.7,     1,    2,   true}},
    {"specular",                          {400,  60,   0,    1,    0.3,    0.5,       0,    0.7,     3,    0,   true}},
    {"diffuse and specular",              {400,  60,   0,    1,    0.3,    0.5,       0,      0,     3,    0,   true}},
    {"all but faces and a light",         {  0,  60,   0,    1,      0,      0,       0,    0.9,     1,    0,  false}},
    {"most objects",                      {  3,   1,   0,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"the owners of 40401 corners",       {400,  60, 200,    1,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    {"what a second side of faces shows", {400,  60,   0,    2,    0.3,    0.5,     0.4,    0.7,     3,    0,   true}},
    /* clang-format on */
};

#define OMISSIONS (sizeof omissions / sizeof *omissions)

/* Waves on a square sheet; sides: 0 for vertices alone. */
static void write_grid(FILE *file, unsigned edge, double height, unsigned sides, unsigned first)
{
    for (unsigned j = 0; j <= edge; j++)
        for (unsigned i = 0; i <= edge; i++) {
            double x = 6.0 * i / edge - 3, z = 6.0 * j / edge - 3;
            fprintf(file, "v %.6f %.6f %.6f\n", x, height + 0.2 * sin(3 * x) * cos(2 * z), z);
        }
    for (unsigned j = 0; sides > 0 && j < edge; j++)
        for (unsigned i = 0; i < edge; i++) {
            unsigned a = first + j * (edge + 1) + i, b = a + edge + 1;
            fprintf(file, "f %u %u %u\nf %u %u %u\n", a, b, a + 1, a + 1, b, b + 1);
            if (sides > 1) fprintf(file, "f %u %u %u\nf %u %u %u\n", a + 1, b, a, b + 1, b, a + 1);
        }
}

static void write_mesh(const char *folder, const struct contents *contents)
{
    FILE *file = open_to_write("%s/omit.obj", folder);
    unsigned edge = contents->grid;
    write_grid(file, edge, -1, contents->sides, 1);
    if (contents->idle_grid)
        write_grid(file, contents->idle_grid, -2, 0, (edge + 1) * (edge + 1) + 1);
    close_written(file);
}

/* A spiral from the middle outwards. */
static void write_spheres(FILE *file, unsigned count)
{
    for (unsigned i = 0; i < count; i++) {
        double turn = 2.399963 * i, way = 2.6 * sqrt((i + 0.5) / count);
        fprintf(file, "[sphere s%u]\ncenter = %.6f %.6f %.6f\nradius = 0.11\nmaterial = %s\n", i,
                way * cos(turn), 0.3 * sin(5 * way) - 0.3, way * sin(turn),
                i % 2 ? "shiny" : "clear");
    }
}

static void write_materials(FILE *file, const struct contents *contents)
{
    fprintf(file,
            "[material shiny]\ncolor = 0.9 0.5 0.4\nambient = 0.1\ndiffuse = %g\nspecular = %g\n"
            "shininess = 20\nreflection = %g\n",
            contents->diffuse, contents->specular, contents->reflection);
    fprintf(file,
            "[material clear]\ncolor = 0.6 0.8 0.9\nambient = 0.1\ndiffuse = %g\nspecular = %g\n"
            "shininess = 50\nreflection = %g\ntransmission = %g\nior = 1.5\n",
            contents->diffuse, contents->specular, contents->reflection / 2,
            contents->transmission);
}

static void write_lights(FILE *file, const struct contents *contents)
{
    for (unsigned i = 0; i < contents->lights + contents->black_lights; i++) {
        double strength = i < contents->lights ? 0.5 : 0;
        fprintf(file, "[light l%u]\nposition = %g 6 %g\ncolor = %g %g %g\n", i, 3.0 * i - 3,
                2.0 + i, strength, strength, strength);
    }
}

static void write_scene(const char *folder, const struct contents *contents, unsigned width)
{
    FILE *file = open_to_write("%s/omit.ini", folder);
    fprintf(file,
            "[image]\nwidth = %u\nheight = %u\n[camera]\neye = 0 4 6\nlook_at = 0 -0.6 0\n"
            "[render]\nshadows = %s\n",
            width, width * 3 / 4, contents->shadows ? "yes" : "no");
    write_materials(file, contents);
    write_lights(file, contents);
    write_spheres(file, contents->spheres);
    if (contents->grid) {
        fprintf(file, "[mesh sheet]\nfile = omit.obj\nmaterial = shiny\n");
        write_mesh(folder, contents);
    }
    close_written(file);
}

/* ---- runs ---- */

struct run {
    double cpu_s;
    double scene_bytes;
    double resident_kib;
};

static struct run run_farm(const char *folder, const char *variant)
{
    struct command command = {0};
    struct usage usage;
    command_add(&command, "%s", from_environment("FARM", "./farm"));
    command_add(&command, "%s/omit.ini", folder);
    command_add(&command, "output.image=%s/%s.pfm", folder, variant);
    command_add(&command, "output.report=%s/omit.json", folder);
    command_add(&command, "farm.variant=%s", variant);
    command_add(&command, "output.journal=");
    char *log = format_text("%s/omit.log", folder), *path = format_text("%s/omit.json", folder);
    if (!command_run(&command, log, &usage))
        fatal("farm failed on %s/omit.ini with farm.variant=%s", folder, variant);
    char *report = report_text(path);
    const char *renderer = strstr(report, "\"rank\": 0,");
    if (!renderer) fatal("%s says nothing of rank 0", path);
    struct run run = {report_number(renderer, "cpu_s"), report_number(report, "bytes"),
                      usage.resident_kib};
    free(report);
    free(path);
    free(log);
    return run;
}

static bool pictures_differ(const char *folder)
{
    return run_shell("cmp -s '%s/auto.pfm' '%s/full.pfm'", folder, folder) != 0;
}

/* ---- results ---- */

struct result {
    const char *name;
    double ratio, lowest, highest; /* time of auto / full: median, least and most of the pairs */
    struct run own, full;          /* medians */
    bool differs;
};

/* The medians of `count` runs. */
static struct run median_run(const struct run *runs, unsigned count)
{
    double times[PAIRS_MAX], memory[PAIRS_MAX];
    for (unsigned i = 0; i < count; i++) {
        times[i] = runs[i].cpu_s;
        memory[i] = runs[i].resident_kib;
    }
    return (struct run){median_of(times, count), runs[0].scene_bytes, median_of(memory, count)};
}

static struct result compare(const struct omission *omission, const char *folder, unsigned width,
                             unsigned pairs)
{
    struct run own[PAIRS_MAX], full[PAIRS_MAX];
    double ratios[PAIRS_MAX];
    struct result result = {.name = omission->name};
    write_scene(folder, &omission->contents, width);
    for (unsigned i = 0; i < pairs; i++) {
        /* The order within a pair alternates. */
        if (i % 2) full[i] = run_farm(folder, "full");
        own[i] = run_farm(folder, "auto");
        if (i % 2 == 0) full[i] = run_farm(folder, "full");
        result.differs |= pictures_differ(folder);
        ratios[i] = own[i].cpu_s / full[i].cpu_s;
    }
    result.ratio = median_of(ratios, pairs); /* which sorts them */
    result.lowest = ratios[0];
    result.highest = ratios[pairs - 1];
    result.own = median_run(own, pairs);
    result.full = median_run(full, pairs);
    return result;
}

/* What is saved: time counts if all pairs agree, bytes if there are fewer. */
static const char *verdict(const struct result *result)
{
    bool time = result->highest < 1, bytes = result->own.scene_bytes < result->full.scene_bytes;
    if (result->differs) return "THE PICTURES DIFFER";
    if (time && bytes) return "time and bytes";
    return time ? "time" : bytes ? "bytes" : "nothing";
}

static void write_csv(const struct result *results)
{
    FILE *file = open_to_write("bench/out/omit.csv");
    fprintf(file, "left_out,time_ratio,least,most,own_s,full_s,own_scene_bytes,full_scene_bytes,"
                  "own_resident_kib,full_resident_kib,saves\n");
    for (size_t i = 0; i < OMISSIONS; i++) {
        const struct result *r = &results[i];
        fprintf(file, "%s,%.4f,%.4f,%.4f,%.6f,%.6f,%.0f,%.0f,%.0f,%.0f,%s\n", r->name, r->ratio,
                r->lowest, r->highest, r->own.cpu_s, r->full.cpu_s, r->own.scene_bytes,
                r->full.scene_bytes, r->own.resident_kib, r->full.resident_kib, verdict(r));
    }
    close_written(file);
}

static bool any_differs(const struct result *results)
{
    for (size_t i = 0; i < OMISSIONS; i++)
        if (results[i].differs) return true;
    return false;
}

static void write_table(FILE *file, const struct result *results, unsigned pairs)
{
    fprintf(file,
            "Own variant against the full one, %u pairs each; %s.\n\n"
            "| the scene lacks | CPU time own / full (least .. most) | scene bytes own, full | "
            "resident MiB own, full | saves |\n|---|---|---|---|---|\n",
            pairs,
            any_differs(results) ? "PICTURES DIFFER" : "the pictures are the same, byte for byte");
    for (size_t i = 0; i < OMISSIONS; i++) {
        const struct result *r = &results[i];
        fprintf(file, "| %s | %.3f (%.3f .. %.3f) | %.0f, %.0f | %.1f, %.1f | %s |\n", r->name,
                r->ratio, r->lowest, r->highest, r->own.scene_bytes, r->full.scene_bytes,
                r->own.resident_kib / 1024, r->full.resident_kib / 1024, verdict(r));
    }
}

/* Prints "ok" or "not ok" for each case: ok is the same picture, and never more bytes. Returns whether all are
 * ok. */
static bool write_tap(const struct result *results)
{
    bool all = true;
    printf("1..%zu\n", OMISSIONS);
    for (size_t i = 0; i < OMISSIONS; i++) {
        const struct result *r = &results[i];
        bool good = !r->differs && r->own.scene_bytes <= r->full.scene_bytes;
        printf("%s %zu - the scene lacks %s\n", good ? "ok" : "not ok", i + 1, r->name);
        all = all && good;
    }
    return all;
}

int main(int argc, char **argv)
{
    bool quick = argc == 2 && strcmp(argv[1], "--quick") == 0;
    char folder[] = "/tmp/farm_omit_XXXXXX";
    struct result results[OMISSIONS];
    unsigned pairs = quick ? 1 : 9;
    if (argc > 1 && !quick) fatal("usage: omit [--quick]");
    if (!mkdtemp(folder)) fatal("cannot make a folder in /tmp");
    for (size_t i = 0; i < OMISSIONS; i++)
        results[i] = compare(&omissions[i], folder, quick ? 40 : 480, pairs);
    run_shell("rm -r '%s'", folder);
    if (quick) return !write_tap(results);
    FILE *file = open_to_write("bench/out/omit.md");
    write_table(file, results, pairs);
    close_written(file);
    write_csv(results);
    write_table(stdout, results, pairs);
    return any_differs(results);
}
