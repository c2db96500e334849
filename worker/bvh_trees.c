#include "worker/bvh_trees.h"

#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "common/message.h"
#include "common/whole.h"
#include "worker/bvh_bounded.h"
#include "worker/bvh_cubes.h"
#include "worker/bvh_item.h"
#include "worker/primitive.h"

/* ---- the size of the scene ---- */

/* The largest distance along an axis from the centre to a point of the box. */
static double farthest_from(const struct bounds *box, const double center[3])
{
    double far = 0;
    for (unsigned axis = 0; axis < 3; axis++)
        far = larger_number(far, larger_number(fabs(box->min[axis] - center[axis]),
                                               fabs(box->max[axis] - center[axis])));
    return far;
}

/* The box around all primitives, and the smallest size above 0 of one. */
struct measuring {
    const struct scene *scene;
    struct sizes {
        struct bounds all;
        double least;
    } * parts; /* one for each part of CHUNK_ITEMS primitives */
};

static void measure_part(void *context, uint32_t iteration)
{
    const struct measuring *measuring = context;
    const struct scene *scene = measuring->scene;
    uint64_t first = (uint64_t)iteration * CHUNK_ITEMS, left = bounded_count(scene) - first;
    uint32_t count = left < CHUNK_ITEMS ? (uint32_t)left : CHUNK_ITEMS;
    struct sizes part = {BOUNDS_NONE, INFINITE};
    for (uint32_t i = 0, id = bounded_id(scene, first); i < count; i++) {
        if (i > 0) id = bounded_id_after(scene, id);
        struct bounds box = primitive_bounds(scene, id);
        double size = bounds_size(&box);
        bounds_add(&part.all, &box);
        if (size > 0) part.least = smaller_number(part.least, size);
    }
    measuring->parts[iteration] = part;
}

static struct sizes measure_scene(const struct scene *scene, struct thread_pool *pool)
{
    uint32_t parts = divide_up((uint32_t)bounded_count(scene), CHUNK_ITEMS);
    struct measuring measuring = {scene, allocate(parts, sizeof *measuring.parts)};
    struct sizes whole = {BOUNDS_NONE, INFINITE};
    thread_pool_for(pool, parts, measure_part, &measuring);
    for (uint32_t i = 0; i < parts; i++) {
        bounds_add(&whole.all, &measuring.parts[i].all);
        whole.least = smaller_number(whole.least, measuring.parts[i].least);
    }
    free(measuring.parts);
    return whole;
}

/* ---- the centre of most ---- */

/* The boxes sampled to find where most are: a region with half of all has 47 to 53 % of the sample (two standard
 * deviations). */
#define CENTER_BOXES 1024

/* The index of the i-th of `count` samples: of all, or by multiples of the golden ratio, which do not align with the
 * rows of a mesh. */
static uint64_t spread(uint32_t i, uint32_t count, uint64_t all)
{
    double turns = 0.6180339887 * i;
    return count == all ? i : (uint64_t)((turns - floor(turns)) * (double)all);
}

/* Stores the centres of the boxes of up to CENTER_BOXES primitives; returns their number. */
static uint32_t take_middles(const struct scene *scene, double middles[3][CENTER_BOXES])
{
    uint64_t all = bounded_count(scene);
    uint32_t count = all < CENTER_BOXES ? (uint32_t)all : CENTER_BOXES;
    for (uint32_t i = 0; i < count; i++) {
        struct bounds box = primitive_bounds(scene, bounded_id(scene, spread(i, count, all)));
        for (unsigned axis = 0; axis < 3; axis++)
            middles[axis][i] = bounds_middle(&box, axis);
    }
    return count;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Sorts the values; of the two in the middle it returns the larger. */
static double median_of(double *values, uint32_t count)
{
    qsort(values, count, sizeof *values, by_size);
    return values[count / 2];
}

/*
 * The centre of the first tree on an axis is the median of the sampled boxes' centres, if that is further from the
 * origin than CENTER_FAR times their median distance from it. An example is a mesh on a ball as large as a planet: all
 * boxes but one are far from the ball's centre, and float has bits for them or for the ball. Less than half of the
 * boxes may be anywhere else. Otherwise it is the middle of the whole scene, if that is further from the origin than
 * the scene is wide. Otherwise it is 0: a scene at the origin keeps its coordinates, many of which are floats.
 */
#define CENTER_FAR 16

/* Overwrites the middles, of which there must be at least one. */
static double center_on(const struct bounds *all, unsigned axis, double *middles, uint32_t count)
{
    double median = median_of(middles, count);
    for (uint32_t i = 0; i < count; i++)
        middles[i] = fabs(middles[i] - median);
    if (fabs(median) > CENTER_FAR * median_of(middles, count)) return median;
    double middle = bounds_middle(all, axis);
    bool far = isfinite(middle) && fabs(middle) > all->max[axis] - all->min[axis];
    return far ? middle : 0;
}

static void find_center(const struct scene *scene, const struct bounds *all, double center[3])
{
    double middles[3][CENTER_BOXES];
    uint32_t count = take_middles(scene, middles);
    for (unsigned axis = 0; axis < 3; axis++)
        center[axis] = center_on(all, axis, middles[axis], count);
}

/* ---- what is too fine ---- */

/* A box is fine if its size times FINE is below the largest distance of its points from the centre. Outward rounding
 * to float moves each side by up to 1.5 * 2^-23 of the distance, so even the largest fine boxes may grow by three
 * eighths. */
#define FINE 0x1p20

static bool is_fine(const struct bounds *box, const double center[3])
{
    double size = bounds_size(box), far = farthest_from(box, center);
    return size > 0 && size * FINE < far && far < INFINITE;
}

/* Fewer fine primitives are not worth one of TREES_MAX trees. */
#define FINE_MIN 64

struct fine_box {
    struct bounds box;
    uint32_t index; /* as of bounded_id() */
};

/* Fine primitives, in order. Only they are examined again for every further tree. */
struct fine {
    struct fine_box *at; /* owned */
    uint32_t count;
};

static struct fine find_fine(const struct scene *scene, const double center[3])
{
    struct fine fine = {NULL, 0};
    uint32_t all = (uint32_t)bounded_count(scene);
    for (uint32_t i = 0, id = bounded_id(scene, 0); i < all; i++) {
        if (i > 0) id = bounded_id_after(scene, id);
        struct bounds box = primitive_bounds(scene, id);
        if (!is_fine(&box, center)) continue;
        fine.at = grow(fine.at, fine.count, sizeof *fine.at);
        fine.at[fine.count++] = (struct fine_box){box, i};
    }
    return fine;
}

/*
 * Fine boxes only matter where they are crowded. The cube's edge is 1/FINE of a box's distance from the centre, rounded
 * up to a power of two. CROWD boxes side by side on a surface, with their centres in one such cube, are at most about a
 * quarter of the edge wide. As above, rounding to float adds up to three eighths of 1/FINE of the distance: boxes that
 * wide become up to 1.75 to 2.5 times as wide, depending on the power of two, smaller ones more. Specks of dust far
 * from each other do as well in the first tree.
 */
static struct cube cube_of(const struct bounds *box, const double center[3])
{
    struct cube cube = {box, center, 0};
    frexp(farthest_from(box, center) / FINE, &cube.exponent);
    return cube;
}

/* Keeps only the crowded boxes. */
static void keep_crowded(struct fine *fine, const double center[3])
{
    struct cubes cubes = cubes_for(fine->count);
    uint32_t kept = 0;
    for (uint32_t i = 0; i < fine->count; i++)
        cubes_count(&cubes, cube_of(&fine->at[i].box, center));
    for (uint32_t i = 0; i < fine->count; i++)
        if (cubes_crowd(&cubes, cube_of(&fine->at[i].box, center)) >= CROWD)
            fine->at[kept++] = fine->at[i];
    cubes_free(&cubes);
    fine->count = kept;
}

/* ---- their trees ---- */

/* The number of fine boxes whose centres are tried as the centre of a tree. */
#define CENTERS_TRIED 64

/* The centre of a fine box relative to which the fewest sampled boxes are fine. */
static void find_fine_center(const struct fine *fine, double center[3])
{
    struct bounds boxes[CENTER_BOXES];
    uint32_t count = smaller(fine->count, CENTER_BOXES), most = 0;
    for (uint32_t i = 0; i < count; i++)
        boxes[i] = fine->at[spread(i, count, fine->count)].box;
    for (uint32_t i = 0; i < count && i < CENTERS_TRIED; i++) {
        double middle[3];
        uint32_t near = 0;
        for (unsigned axis = 0; axis < 3; axis++)
            middle[axis] = bounds_middle(&boxes[i], axis);
        for (uint32_t k = 0; k < count; k++)
            near += !is_fine(&boxes[k], middle);
        if (near <= most) continue;
        most = near;
        memcpy(center, middle, sizeof middle);
    }
}

/* Adds a tree for the boxes that are not fine relative to this centre, and removes them from *fine. false: they are
 * too few. */
static bool add_tree(struct fine *fine, const double center[3], struct bvh_trees *trees)
{
    uint32_t near = 0, kept = 0;
    for (uint32_t i = 0; i < fine->count; i++)
        near += !is_fine(&fine->at[i].box, center);
    if (near < FINE_MIN) return false;
    for (uint32_t i = 0; i < fine->count; i++) {
        if (is_fine(&fine->at[i].box, center))
            fine->at[kept++] = fine->at[i];
        else
            trees->tree_of[fine->at[i].index] = (uint8_t)trees->count;
    }
    fine->count = kept;
    memcpy(trees->center[trees->count++], center, 3 * sizeof *center);
    return true;
}

static void remove_first_tree(struct bvh_trees *trees, uint32_t all)
{
    for (uint32_t i = 0; i < all; i++)
        trees->tree_of[i]--;
    trees->count--;
    memmove(trees->center[0], trees->center[1], trees->count * sizeof *trees->center);
}

static void divide(const struct scene *scene, struct bvh_trees *trees)
{
    uint32_t all = (uint32_t)bounded_count(scene);
    struct fine fine = find_fine(scene, trees->center[0]);
    if (fine.count >= FINE_MIN) keep_crowded(&fine, trees->center[0]);
    if (fine.count >= FINE_MIN) {
        trees->tree_of = allocate(all, 1);
        memset(trees->tree_of, 0, all);
    }
    while (fine.count >= FINE_MIN && trees->count < TREES_MAX) {
        double center[3];
        find_fine_center(&fine, center);
        if (!add_tree(&fine, center, trees)) break;
    }
    free(fine.at);
    if (trees->count > 1 && !memchr(trees->tree_of, 0, all)) remove_first_tree(trees, all);
}

void bvh_trees_find(const struct scene *scene, struct thread_pool *pool, struct bvh_trees *trees)
{
    struct sizes whole = measure_scene(scene, pool);
    *trees = (struct bvh_trees){.count = 1};
    find_center(scene, &whole.all, trees->center[0]);
    if (whole.least * FINE < farthest_from(&whole.all, trees->center[0])) divide(scene, trees);
}

void bvh_trees_free(struct bvh_trees *trees)
{
    free(trees->tree_of);
}
