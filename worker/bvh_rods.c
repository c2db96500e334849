#include "worker/bvh_rods.h"

#include "common/extremes.h"
#include "worker/bvh_bounded.h"
#include "worker/bvh_cubes.h"
#include "worker/cone.h"

double rod_waste(const struct cone *cone)
{
    struct bounds box = cone_bounds(cone);
    double radius = larger_number(cone->base_radius, cone->apex_radius);
    double length = vec_length(vec_sub(cone->apex, cone->base));
    return bounds_half_area(&box) / (4 * radius * (length + radius));
}

/* The rods of a scene; counts of the boxes of the rods, and of the boxes of their pieces, by grid cubes. */
struct rods {
    const struct scene *scene;
    const struct bvh_trees *trees;
    uint64_t first;    /* index of the first cone, as in bounded_id() */
    uint8_t *halvings; /* of each cone */
    struct cubes wholes, pieces;
};

static const double *center_at(const struct rods *rods, uint32_t cone)
{
    return center_of_bounded(rods->trees, rods->first + cone);
}

static void count_rod(struct rods *rods, uint32_t i)
{
    const struct cone *cone = &scene_cones(rods->scene)[i];
    uint32_t count = UINT32_C(1) << rods->halvings[i];
    struct bounds box = cone_bounds(cone);
    cubes_count(&rods->wholes, cube_around(&box, center_at(rods, i)));
    for (uint32_t piece = 0; piece < count; piece++) {
        box = cone_piece_bounds(cone, piece, count);
        cubes_count(&rods->pieces, cube_around(&box, center_at(rods, i)));
    }
}

/* A ray along a rod in a bundle may meet more than this many times as many pieces, of any rods, as it would meet
 * rods if all were whole. In terms of the time with whole rods, bundles seen from their end take up to 1.2 times
 * as long with 2, 2.2 with 4 and 4.7 with 8. Of 150,000 nearly parallel rods, of which each can have but a few
 * pieces, most are left whole with 2: they take 0.72 of that time, with 4 0.18, and with 8 0.11. */
#define ALONG 4

static bool is_in_bundle(const struct rods *rods, uint32_t i)
{
    const struct cone *cone = &scene_cones(rods->scene)[i];
    uint32_t count = UINT32_C(1) << rods->halvings[i], met = 0;
    struct bounds box = cone_bounds(cone);
    uint32_t whole = cubes_crowd(&rods->wholes, cube_around(&box, center_at(rods, i)));
    for (uint32_t piece = 0; piece < count; piece++) {
        box = cone_piece_bounds(cone, piece, count);
        met += cubes_crowd(&rods->pieces, cube_around(&box, center_at(rods, i)));
    }
    return met > ALONG * whole;
}

void keep_bundles_whole(const struct scene *scene, const struct bvh_trees *trees, uint8_t *halvings)
{
    uint64_t first = bounded_before(scene, PRIMITIVE_CONE);
    uint32_t cones = (uint32_t)scene->primitives[PRIMITIVE_CONE].count, cut = 0, pieces = 0;
    for (uint32_t i = 0; i < cones; i++) {
        cut += halvings[first + i] > 0;
        pieces += halvings[first + i] > 0 ? UINT32_C(1) << halvings[first + i] : 0;
    }
    if (cut == 0) return;
    struct rods rods = {scene, trees, first, halvings + first, cubes_for(cut), cubes_for(pieces)};
    for (uint32_t i = 0; i < cones; i++)
        if (rods.halvings[i] > 0) count_rod(&rods, i);
    for (uint32_t i = 0; i < cones; i++)
        if (rods.halvings[i] > 0 && is_in_bundle(&rods, i)) rods.halvings[i] = 0;
    cubes_free(&rods.wholes);
    cubes_free(&rods.pieces);
}
