/* The scenes of the bench, and their cost maps, which are kept. */
#include <glob.h>
#include <string.h>
#include <sys/stat.h>

#include "bench/balance.h"
#include "common/message.h"

const struct bench_scene bench_scenes[SCENES] = {
    {"lantern", "config/lantern.ini", 14},
    {"garden", "config/garden.ini", 25},
};

#define MAPS_MAX 16

static struct kept_map {
    char path[256];
    struct tile_costs map;
} maps[MAPS_MAX];
static unsigned map_count;

unsigned bench_rounds = 3;

/* This program, which contains the kernel that is measured. */
#define PROGRAM "/proc/self/exe"

/* Whether both exist, and the first was modified after the other. */
static bool is_newer(const char *path, const char *other)
{
    struct stat one, two;
    if (stat(path, &one) != 0 || stat(other, &two) != 0) return false;
    return one.st_mtim.tv_sec > two.st_mtim.tv_sec ||
           (one.st_mtim.tv_sec == two.st_mtim.tv_sec && one.st_mtim.tv_nsec > two.st_mtim.tv_nsec);
}

/* All generated meshes, whichever of them a scene needs. */
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
        costs_measure(&kept->map, scene->config, width, height, samples, bench_rounds, APART_ALL);
        costs_save(&kept->map, path);
    }
    return &kept->map;
}
