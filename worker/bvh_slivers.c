#include "worker/bvh_slivers.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_cubes.h"
#include "worker/bvh_split.h"
#include "worker/primitive.h"

/* Each takes as much memory and time to build as a triangle: a million 40 MB and 0.6 to 1 s of one core. */
#define PIECES_MOST (UINT64_C(1) << 20)

uint64_t sliver_pieces_bound(uint64_t triangles)
{
    uint64_t all = triangles * ((1 << HALVINGS_MAX) - 1);
    return all < PIECES_MOST ? all : PIECES_MOST;
}

/* ---- triangles ---- */

/* The area of a box to that of both sides of the triangle in it, that pieces are left with: a triangle as high as wide
 * has 1 to 2. Seven scenes of pipes, blinds, fans and wheels take the same time with 4 and with 16, within 4 %. */
#define WASTE 8

static double box_area(const struct bounds *box)
{
    double x = box->max[0] - box->min[0], y = box->max[1] - box->min[1];
    double z = box->max[2] - box->min[2];
    return x * y + y * z + z * x;
}

static uint8_t halvings_of(const struct scene *scene, uint32_t id)
{
    const uint32_t *corner = corner_indices(scene, id);
    const struct vec3 *vertices = scene_vertices(scene);
    struct vec3 a = vertices[corner[0]], b = vertices[corner[1]], c = vertices[corner[2]];
    struct bounds box = triangle_bounds(&a, &b, &c);
    double waste = box_area(&box) / vec_length(vec_cross(vec_sub(b, a), vec_sub(c, a)));
    if (!(waste >= 2 * WASTE)) return 0; /* NaN, too: a point */
    return waste < WASTE << HALVINGS_MAX ? (uint8_t)ilogb(waste / WASTE) : HALVINGS_MAX;
}

struct search {
    const struct scene *scene;
    uint8_t *halvings;
    uint32_t *found; /* slivers of each part, of ROUND_ITEMS triangles */
};

static void search_part(void *context, uint32_t round)
{
    const struct search *search = context;
    uint32_t first = round * ROUND_ITEMS,
             left = (uint32_t)scene_triangle_count(search->scene) - first;
    search->found[round] = 0;
    for (uint32_t i = first; i < first + smaller(left, ROUND_ITEMS); i++) {
        search->halvings[i] = halvings_of(search->scene, bounded_id(search->scene, i));
        search->found[round] += search->halvings[i] > 0;
    }
}

/* Returns how many slivers there are. */
static uint32_t find_slivers(const struct scene *scene, struct crew *crew, uint8_t *halvings)
{
    uint32_t rounds = divide_up((uint32_t)scene_triangle_count(scene), ROUND_ITEMS), found = 0;
    struct search search = {scene, halvings, allocate(rounds, sizeof *search.found)};
    crew_share(crew, rounds, search_part, &search);
    for (uint32_t i = 0; i < rounds; i++)
        found += search.found[i];
    free(search.found);
    return found;
}

/* ---- crowds ---- */

static uint32_t tree_of(const struct bvh_trees *trees, uint32_t i)
{
    return trees->tree_of ? trees->tree_of[i] : 0;
}

/* As wide as the triangle's box, or up to twice that. */
static struct cube cube_of(const struct scene *scene, const struct bvh_trees *trees, uint32_t i,
                           struct bounds *box)
{
    *box = primitive_bounds(scene, bounded_id(scene, i));
    struct cube cube = {box, trees->center[tree_of(trees, i)], 0};
    frexp(bounds_size(box), &cube.exponent);
    return cube;
}

/* One alone costs a test; so does what is next to it. */
static void keep_crowded(const struct scene *scene, const struct bvh_trees *trees, uint32_t found,
                         uint8_t *halvings)
{
    struct cubes cubes = cubes_for(found);
    struct bounds box;
    for (uint32_t i = 0; i < scene_triangle_count(scene); i++)
        if (halvings[i] > 0) cubes_count(&cubes, cube_of(scene, trees, i, &box));
    for (uint32_t i = 0; i < scene_triangle_count(scene); i++)
        if (halvings[i] > 0 && !cubes_are_crowded(&cubes, cube_of(scene, trees, i, &box)))
            halvings[i] = 0;
    cubes_free(&cubes);
}

/* ---- what pieces are worth ---- */

/* Of the area of the box around a tree's crowds: a piece with less is not halved, as few rays come near it. Building
 * and rendering those seven scenes (640 x 480, 4 samples) take 17 % longer with 2^-8; with 2^-12 the same, but twice
 * the pieces, which hair and small pipes around a large mesh pay for. */
#define WORTH 0x1p-10

/* Of the boxes around each tree's crowds. */
static void find_areas(const struct scene *scene, const struct bvh_trees *trees,
                       const uint8_t *halvings, double areas[TREES_MAX])
{
    struct bounds boxes[TREES_MAX];
    for (uint32_t tree = 0; tree < TREES_MAX; tree++)
        boxes[tree] = BOUNDS_NONE;
    for (uint32_t i = 0; i < scene_triangle_count(scene); i++) {
        if (halvings[i] == 0) continue;
        struct bounds box = primitive_bounds(scene, bounded_id(scene, i));
        bounds_add(&boxes[tree_of(trees, i)], &box);
    }
    for (uint32_t tree = 0; tree < trees->count; tree++)
        areas[tree] = box_area(&boxes[tree]);
}

/* Each leaves pieces with a quarter of the area. */
static uint8_t halvings_worth(double share)
{
    if (!(share >= WORTH)) return 0; /* NaN, too: areas may be infinite */
    return (uint8_t)(1 + ilogb(share / WORTH) / 2);
}

static void leave_small_pieces(const struct scene *scene, const struct bvh_trees *trees,
                               uint8_t *halvings)
{
    double areas[TREES_MAX];
    find_areas(scene, trees, halvings, areas);
    for (uint32_t i = 0; i < scene_triangle_count(scene); i++) {
        if (halvings[i] == 0) continue;
        struct bounds box = primitive_bounds(scene, bounded_id(scene, i));
        uint8_t worth = halvings_worth(box_area(&box) / areas[tree_of(trees, i)]);
        if (halvings[i] > worth) halvings[i] = worth;
    }
}

/* Halvings of a triangle, at most, with which all pieces are within their bound. */
static uint8_t most_halvings(uint32_t triangles, const uint8_t *halvings)
{
    uint32_t counts[HALVINGS_MAX + 1] = {0};
    for (uint32_t i = 0; i < triangles; i++)
        counts[halvings[i]]++;
    uint64_t rest = sliver_pieces_bound(triangles), slivers = triangles;
    for (uint8_t most = 0; most < HALVINGS_MAX; most++) {
        slivers -= counts[most]; /* which are halved more often, into as many pieces more */
        uint64_t more = slivers << most;
        if (more > rest) return most;
        rest -= more;
    }
    return HALVINGS_MAX;
}

void bvh_slivers_find(const struct scene *scene, struct crew *crew, const struct bvh_trees *trees,
                      struct bvh_slivers *slivers)
{
    uint32_t triangles = (uint32_t)scene_triangle_count(scene);
    *slivers = (struct bvh_slivers){NULL};
    if (triangles < CROWD) return;
    uint8_t *halvings = allocate(triangles, 1);
    uint32_t found = find_slivers(scene, crew, halvings);
    if (found < CROWD) {
        free(halvings);
        return;
    }
    keep_crowded(scene, trees, found, halvings);
    leave_small_pieces(scene, trees, halvings);
    uint8_t most = most_halvings(triangles, halvings);
    for (uint32_t i = 0; i < triangles; i++)
        if (halvings[i] > most) halvings[i] = most;
    slivers->halvings = halvings;
}

void bvh_slivers_free(struct bvh_slivers *slivers)
{
    free(slivers->halvings);
}
