#include <errno.h>
#include <glob.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <time.h>

#include "bench/balance.h"
#include "common/message.h"

const struct bench_scene bench_scenes[SCENES] = {
    {"lantern", "config/lantern.ini", 14},
    {"garden", "config/garden.ini", 25},
};

/* In the order in which they stand in the report. */
static const char *const sections[] = {"marks", "figures", "static",   "real",
                                       "model", "plan",    "messages", "costs"};

#define SECTIONS (sizeof sections / sizeof *sections)

static FILE *open_file(const char *folder, const char *name, const char *suffix, const char *mode)
{
    char path[256];
    snprintf(path, sizeof path, "%s/%s%s", folder, name, suffix);
    FILE *file = fopen(path, mode);
    if (!file && *mode == 'w') fatal("cannot write %s: %s", path, strerror(errno));
    return file;
}

FILE *open_out(const char *name)
{
    return open_file(OUT_FOLDER, name, "", "w");
}

FILE *open_section(const char *section, const char *heading)
{
    char when[32];
    time_t now = time(NULL);
    strftime(when, sizeof when, "%Y-%m-%d %H:%M", localtime(&now));
    FILE *file = open_file(KEPT_FOLDER, section, ".part", "w");
    fprintf(file, "## %s\n\n<!-- BALANCE_OPTIONS=\"--only %s\", %s -->\n\n", heading, section,
            when);
    return file;
}

void close_section(FILE *file, const char *section)
{
    char part[256], whole[256];
    snprintf(part, sizeof part, KEPT_FOLDER "/%s.part", section);
    snprintf(whole, sizeof whole, KEPT_FOLDER "/%s.md", section);
    if (fclose(file) != 0 || rename(part, whole) != 0)
        fatal("cannot write %s: %s", whole, strerror(errno));
}

void join_report(void)
{
    FILE *out = open_out("balance.md");
    fprintf(out, "# Balance\n\n");
    for (size_t i = 0; i < SECTIONS; i++) {
        char text[4096];
        size_t bytes;
        FILE *file = open_file(KEPT_FOLDER, sections[i], ".md", "r");
        if (!file) continue;
        while ((bytes = fread(text, 1, sizeof text, file)) > 0)
            fwrite(text, 1, bytes, out);
        fputc('\n', out);
        fclose(file);
    }
    if (fclose(out) != 0) fatal("cannot write the report");
}

void plot(const char *script)
{
    char command[256];
    snprintf(command, sizeof command, "cd " OUT_FOLDER " && gnuplot %s", script);
    if (system(command) != 0) fatal("gnuplot does not like " OUT_FOLDER "/%s", script);
}

/* ---- what is kept ---- */

#define MAPS_MAX 16

static struct kept_map {
    char path[256];
    struct tile_costs map;
} maps[MAPS_MAX];
static unsigned map_count;

unsigned bench_rounds = 3;

/* This program, of which the kernel that is measured is a part. */
#define PROGRAM "/proc/self/exe"

/* Whether both are there, and the first was written behind the other. */
static bool is_newer(const char *path, const char *other)
{
    struct stat one, two;
    if (stat(path, &one) != 0 || stat(other, &two) != 0) return false;
    return one.st_mtim.tv_sec > two.st_mtim.tv_sec ||
           (one.st_mtim.tv_sec == two.st_mtim.tv_sec && one.st_mtim.tv_nsec > two.st_mtim.tv_nsec);
}

/* The meshes that scenes are made of: whichever of them a scene needs. */
#define MESHES "config/generated/*"

static bool is_newer_than_meshes(const char *path)
{
    glob_t meshes;
    bool newer = true;
    if (glob(MESHES, 0, NULL, &meshes) != 0) return false;
    for (size_t i = 0; newer && i < meshes.gl_pathc; i++)
        newer = is_newer(path, meshes.gl_pathv[i]);
    globfree(&meshes);
    return newer;
}

const struct tile_costs *kept_costs(const struct bench_scene *scene, uint32_t width,
                                    uint32_t height, uint32_t samples)
{
    char path[256];
    snprintf(path, sizeof path, KEPT_FOLDER "/costs_%s_%ux%u_%u.bin", scene->name, width, height,
             samples);
    for (unsigned i = 0; i < map_count; i++)
        if (strcmp(maps[i].path, path) == 0) return &maps[i].map;
    if (map_count == MAPS_MAX) fatal("too many cost maps");
    struct kept_map *kept = &maps[map_count++];
    snprintf(kept->path, sizeof kept->path, "%s", path);
    if (!is_newer(path, PROGRAM) || !is_newer(path, scene->config) || !is_newer_than_meshes(path) ||
        !costs_read(&kept->map, path)) {
        fprintf(stderr, "measuring the costs of %s, %u x %u, %u samples\n", scene->name, width,
                height, samples);
        costs_measure(&kept->map, scene->config, width, height, samples, bench_rounds, APART_ALL);
        costs_save(&kept->map, path);
    }
    return &kept->map;
}
