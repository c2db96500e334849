#include "worker/radiance_clusters.h"

#include <stdlib.h>

#include "common/message.h"
#include "worker/primitive.h"
#include "worker/radiance.h"

/* A smaller loss than this is little help in bounding the brightness of a surface. */
#define LITTLE_LOSS 0x1p-6

static enum passing passing_of(const struct material *material)
{
    if (!(material->reflection > 0) && !(material->transmission > 0)) return PASSES_NOTHING;
    return vec_max(passed_by(material)) < 1 - LITTLE_LOSS ? PASSES_LESS : PASSES_ALL;
}

/* For each material, whether its surfaces are of this kind; the caller frees the array. */
static bool *materials_of(const struct scene *scene, enum passing passing)
{
    bool *wanted = allocate_zeroed((size_t)scene->materials.count, sizeof *wanted);
    for (uint32_t i = 0; i < scene->materials.count; i++)
        wanted[i] = passing_of(&scene_materials(scene)[i]) == passing;
    return wanted;
}

static struct bounds bounds_of(const struct scene *scene, uint32_t id)
{
    if (primitive_kind(id) == PRIMITIVE_PLANE) return BOUNDS_ALL;
    return primitive_bounds(scene, id);
}

static void measure(const struct scene *scene, const uint32_t *ids,
                    struct radiance_cluster *cluster)
{
    cluster->box = BOUNDS_NONE;
    for (uint32_t i = 0; i < cluster->count; i++) {
        struct bounds box = bounds_of(scene, ids[cluster->first + i]);
        bounds_add(&cluster->box, &box);
    }
}

static unsigned longest_axis(const struct bounds *box)
{
    unsigned longest = 0;
    for (unsigned axis = 1; axis < 3; axis++)
        if (box->max[axis] - box->min[axis] > box->max[longest] - box->min[longest]) longest = axis;
    return longest;
}

static double extent_of(const struct radiance_cluster *cluster)
{
    return cluster->count > 1 ? bounds_size(&cluster->box) : 0;
}

/* Splits a cluster in two at the middle of its longest edge; false if all primitives are on one side. */
static bool split(const struct scene *scene, uint32_t *ids, struct radiance_cluster *cluster,
                  struct radiance_cluster *rest)
{
    unsigned axis = longest_axis(&cluster->box);
    double middle = bounds_middle(&cluster->box, axis);
    uint32_t below = 0, *id = ids + cluster->first;
    struct bounds parts[2] = {BOUNDS_NONE, BOUNDS_NONE};
    for (uint32_t i = 0; i < cluster->count; i++) {
        struct bounds box = bounds_of(scene, id[i]);
        bool is_below = bounds_middle(&box, axis) < middle;
        bounds_add(&parts[!is_below], &box);
        if (!is_below) continue;
        uint32_t other = id[below];
        id[below++] = id[i];
        id[i] = other;
    }
    if (below == 0 || below == cluster->count) return false;
    *rest = (struct radiance_cluster){
        .first = cluster->first + below, .count = cluster->count - below, .box = parts[1]};
    cluster->count = below;
    cluster->box = parts[0];
    return true;
}

uint32_t radiance_clusters(const struct scene *scene, uint32_t *ids, uint32_t count,
                           struct radiance_cluster *clusters, uint32_t most)
{
    uint32_t parts = 1;
    bool whole[RADIANCE_GROUPS] = {false}; /* cannot be split */
    clusters[0] = (struct radiance_cluster){.first = 0, .count = count};
    measure(scene, ids, &clusters[0]);
    while (parts < most) {
        uint32_t longest = parts;
        double extent = 0;
        for (uint32_t i = 0; i < parts; i++) {
            if (whole[i] || !(extent_of(&clusters[i]) > extent)) continue;
            extent = extent_of(&clusters[i]);
            longest = i;
        }
        if (longest == parts) break;
        if (split(scene, ids, &clusters[longest], &clusters[parts]))
            parts++;
        else
            whole[longest] = true;
    }
    return parts;
}

uint32_t *radiance_ids(const struct scene *scene, enum passing passing, bool bounded,
                       uint32_t *count)
{
    uint32_t *ids = allocate((size_t)scene_primitive_count(scene), sizeof *ids);
    bool *wanted = materials_of(scene, passing);
    const uint32_t *duplicate = scene_duplicates(scene), *end = duplicate + scene->duplicates.count;
    *count = 0;
    for (int kind = 0; kind < PRIMITIVE_KINDS; kind++) {
        if ((kind != PRIMITIVE_PLANE) != bounded) continue;
        for (uint32_t i = 0; i < scene->primitives[kind].count; i++) {
            uint32_t id = primitive_id((enum primitive_kind)kind, i);
            while (duplicate < end && *duplicate < id)
                duplicate++;
            if (duplicate < end && *duplicate == id) continue;
            if (wanted[primitive_material(scene, id)]) ids[(*count)++] = id;
        }
    }
    free(wanted);
    return ids;
}
