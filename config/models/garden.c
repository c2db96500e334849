/* The garden's files: one per part, so that a scene can leave parts out. */
#include "config/models/garden.h"
#include "config/models/models.h"

typedef void add_part(struct mesh *mesh);

static const struct part {
    const char *file;
    add_part *add[4];
} parts[] = {
    {"garden_ground.obj", {add_ground, add_hills, add_forest, add_geese}},
    {"garden_water.obj", {add_water}},
    {"garden_pond.obj", {add_pebbles, add_koi, add_lilies}},
    {"garden_stones.obj", {add_stones}},
    {"garden_pine.obj", {add_pine}},
    {"garden_plants.obj", {add_maple, add_shrubs, add_irises, add_grass}},
    {"garden_built.obj", {add_bridge, add_lanterns}},
};

bool write_garden(const char *folder)
{
    bool good = true;
    for (size_t i = 0; i < sizeof parts / sizeof parts[0] && good; i++) {
        struct mesh mesh;
        mesh_init(&mesh);
        for (size_t k = 0; k < 4 && parts[i].add[k] != NULL; k++)
            parts[i].add[k](&mesh);
        good = mesh_write_obj(&mesh, folder, parts[i].file);
        mesh_free(&mesh);
    }
    return good;
}
