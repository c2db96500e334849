#include "worker/bvh_slivers.h"

#include <math.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_bounded.h"
#include "worker/bvh_cubes.h"
#include "worker/bvh_item.h"
#include "worker/bvh_rods.h"
#include "worker/primitive.h"

/* Each takes as much memory and time to build as a triangle: a million takes 40 MB and 0.6 to 1 s of one core; of
 * rods 55 MB and 1.5 s. */
#define PIECES_MOST (UINT64_C(1) << 20)

static uint64_t pieces_bound(uint64_t slivers)
{
    uint64_t all = slivers * ((1 << HALVINGS_MAX) - 1);
    return all < PIECES_MOST ? all : PIECES_MOST;
}

uint64_t sliver_pieces_bound(const struct scene *scene)
{
    return pieces_bound(scene_triangle_count(scene) + scene->primitives[PRIMITIVE_CONE].count);
}

uint64_t rod_pieces_bound(const struct scene *scene)
{
    return pieces_bound(scene->primitives[PRIMITIVE_CONE].count);
}

/* ---- one by one ---- */

/* The ratio that cutting aims at: half the surface of a box to the area of both sides of the triangle in it. A
 * triangle as high as wide has 1 to 2. Seven scenes of pipes, blinds, fans and wheels take the same time with 4 and
 * with 16, within 4 %. */
#define WASTE 8

/* The same for rods, with rod_waste() as the ratio. As the test of a rod takes longer than that of a triangle,
 * cutting pays for thicker pieces. Bundles take a third less time with 4 than with 8, and with 2 the same as with 4. */
#define ROD_WASTE 4

static double triangle_waste(const struct scene *scene, uint32_t id)
{
    struct vec3 at[3];
    triangle_vertices(scene, id, at);
    struct bounds box = triangle_bounds(&at[0], &at[1], &at[2]);
    struct vec3 across = vec_cross(vec_sub(at[1], at[0]), vec_sub(at[2], at[0]));
    return bounds_half_area(&box) / vec_length(across);
}

static uint8_t halvings_of(const struct scene *scene, uint32_t id)
{
    double waste = 0;
    if (is_triangle(id)) waste = triangle_waste(scene, id) / WASTE;
    if (primitive_kind(id) == PRIMITIVE_CONE)
        waste = rod_waste(&scene_cones(scene)[primitive_index(id)]) / ROD_WASTE;
    if (!(waste >= 2)) return 0; /* includes NaN, of a triangle that is a point */
    return waste < 1 << HALVINGS_MAX ? (uint8_t)ilogb(waste) : HALVINGS_MAX;
}

struct search {
    const struct scene *scene;
    uint8_t *halvings;
    uint32_t *found; /* number of slivers in each part of CHUNK_ITEMS primitives */
};

static void search_part(void *context, uint32_t iteration)
{
    const struct search *search = context;
    uint32_t first = iteration * CHUNK_ITEMS, left = (uint32_t)bounded_count(search->scene) - first;
    search->found[iteration] = 0;
    for (uint32_t i = first; i < first + smaller(left, CHUNK_ITEMS); i++) {
        search->halvings[i] = halvings_of(search->scene, bounded_id(search->scene, i));
        search->found[iteration] += search->halvings[i] > 0;
    }
}

/* Considers each primitive on its own. Returns the number of slivers. */
static uint32_t find_slivers(const struct scene *scene, struct thread_pool *pool, uint8_t *halvings)
{
    uint32_t parts = divide_up((uint32_t)bounded_count(scene), CHUNK_ITEMS), found = 0;
    struct search search = {scene, halvings, allocate(parts, sizeof *search.found)};
    thread_pool_for(pool, parts, search_part, &search);
    for (uint32_t i = 0; i < parts; i++)
        found += search.found[i];
    free(search.found);
    return found;
}

/* ---- crowds ---- */

static struct cube cube_of(const struct scene *scene, const struct bvh_trees *trees, uint32_t i,
                           struct bounds *box)
{
    *box = primitive_bounds(scene, bounded_id(scene, i));
    return cube_around(box, center_of_bounded(trees, i));
}

/* Leaves slivers whole that are not crowded: such a one costs a ray only one more test. */
static void keep_crowded(const struct scene *scene, const struct bvh_trees *trees, uint32_t found,
                         uint8_t *halvings)
{
    struct cubes cubes = cubes_for(found);
    struct bounds box;
    uint32_t all = (uint32_t)bounded_count(scene);
    for (uint32_t i = 0; i < all; i++)
        if (halvings[i] > 0) cubes_count(&cubes, cube_of(scene, trees, i, &box));
    for (uint32_t i = 0; i < all; i++)
        if (halvings[i] > 0 && cubes_crowd(&cubes, cube_of(scene, trees, i, &box)) < CROWD)
            halvings[i] = 0;
    cubes_free(&cubes);
}

/* ---- what pieces are worth ---- */

/* The least area of a box or piece that is halved, as a share of the area of the box around the tree's crowds: few
 * rays come near a smaller one. Building and rendering those seven scenes (640 x 480, 4 samples) takes 17 % longer
 * with 2^-8; with 2^-12 the same, but twice the pieces, at the expense of hair and of small pipes around a large
 * mesh. */
#define WORTH 0x1p-10

/* Finds the areas of the boxes around the crowds of each tree. */
static void find_areas(const struct scene *scene, const struct bvh_trees *trees,
                       const uint8_t *halvings, double areas[TREES_MAX])
{
    struct bounds boxes[TREES_MAX];
    uint32_t all = (uint32_t)bounded_count(scene);
    for (uint32_t tree = 0; tree < TREES_MAX; tree++)
        boxes[tree] = BOUNDS_NONE;
    for (uint32_t i = 0; i < all; i++) {
        if (halvings[i] == 0) continue;
        struct bounds box = primitive_bounds(scene, bounded_id(scene, i));
        bounds_add(&boxes[tree_of_bounded(trees, i)], &box);
    }
    for (uint32_t tree = 0; tree < trees->count; tree++)
        areas[tree] = bounds_half_area(&boxes[tree]);
}

/* The number of halvings that pay off: each leaves pieces with a quarter of the area. */
static uint8_t halvings_worth(double share)
{
    if (!(share >= WORTH)) return 0; /* includes NaN, as areas may be infinite */
    return (uint8_t)(1 + ilogb(share / WORTH) / 2);
}

static void leave_small_pieces(const struct scene *scene, const struct bvh_trees *trees,
                               uint8_t *halvings)
{
    double areas[TREES_MAX];
    uint32_t all = (uint32_t)bounded_count(scene);
    find_areas(scene, trees, halvings, areas);
    for (uint32_t i = 0; i < all; i++) {
        if (halvings[i] == 0) continue;
        struct bounds box = primitive_bounds(scene, bounded_id(scene, i));
        uint8_t worth = halvings_worth(bounds_half_area(&box) / areas[tree_of_bounded(trees, i)]);
        if (halvings[i] > worth) halvings[i] = worth;
    }
}

/* The largest limit on halvings that keeps the pieces within their bound. */
static uint8_t most_halvings(const struct scene *scene, const uint8_t *halvings)
{
    uint32_t all = (uint32_t)bounded_count(scene), counts[HALVINGS_MAX + 1] = {0};
    for (uint32_t i = 0; i < all; i++)
        counts[halvings[i]]++;
    uint64_t rest = sliver_pieces_bound(scene), slivers = all;
    for (uint8_t most = 0; most < HALVINGS_MAX; most++) {
        /* those that are halved more often; the next halving adds `more` pieces */
        slivers -= counts[most];
        uint64_t more = slivers << most;
        if (more > rest) return most;
        rest -= more;
    }
    return HALVINGS_MAX;
}

static void keep_few(const struct scene *scene, uint8_t *halvings)
{
    uint8_t most = most_halvings(scene, halvings);
    uint32_t all = (uint32_t)bounded_count(scene);
    for (uint32_t i = 0; i < all; i++)
        if (halvings[i] > most) halvings[i] = most;
}

uint8_t *bvh_slivers_find(const struct scene *scene, struct thread_pool *pool,
                          const struct bvh_trees *trees)
{
    if (scene_triangle_count(scene) + scene->primitives[PRIMITIVE_CONE].count < CROWD) return NULL;
    uint8_t *halvings = allocate(bounded_count(scene), 1);
    uint32_t found = find_slivers(scene, pool, halvings);
    if (found < CROWD) {
        free(halvings);
        return NULL;
    }
    keep_crowded(scene, trees, found, halvings);
    leave_small_pieces(scene, trees, halvings);
    keep_few(scene, halvings);
    keep_bundles_whole(scene, trees, halvings);
    return halvings;
}
