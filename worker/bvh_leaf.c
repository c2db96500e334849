/* What stands in a leaf of the tree. */
#include <math.h>
#include <string.h>

#include "worker/bvh.h"
#include "worker/bvh_split.h"
#include "worker/primitive.h"

struct bvh_leaf bvh_leaf_of(const struct scene *scene, uint32_t id)
{
    return (struct bvh_leaf){.id = id & INT32_MAX, .transparent = transmits(scene, id)};
}

/* The corners of a leaf's triangles, from the tree's centre. */
struct corner_reader {
    const struct scene *scene;
    const double *center;
    const struct bvh_leaf *leaves;
};

static double corner_place(const struct corner_reader *reader, uint32_t i, unsigned corner,
                           unsigned axis)
{
    const uint32_t *vertices = corner_indices(reader->scene, reader->leaves[i].id);
    const struct vec3 *at = &scene_vertices(reader->scene)[vertices[corner]];
    return vec_component(at, axis) - reader->center[axis];
}

/*
 * The unit: a power of two, so that all places are at most PLACE_MAX, and coordinates are no more
 * than COORDINATE_MAX of it, with an inverse that is a normal float; 0 where there is none.
 */
#define PLACE_MAX      65534.0
#define COORDINATE_MAX 0x1p40
#define UNIT_MIN       0x1p-120
#define UNIT_MAX       0x1p120

static double find_unit(double extent, double largest)
{
    int exponent;
    if (!(largest <= UNIT_MAX)) return 0; /* nor is it NaN */
    frexp(larger(extent / PLACE_MAX, UNIT_MIN), &exponent);
    double unit = ldexp(1, exponent);
    return largest <= COORDINATE_MAX * unit ? unit : 0;
}

static uint32_t count_triangles(const struct bvh_leaf *leaves, uint32_t count)
{
    uint32_t triangles = 0;
    while (triangles < count && is_triangle(leaves[triangles].id))
        triangles++;
    return triangles;
}

static void write_places(const struct corner_reader *reader, uint32_t triangles, double unit,
                         struct bvh_corners *corners)
{
    for (unsigned row = 0; row < CORNER_ROWS; row++) {
        double base = (double)corners->base[row / 3];
        for (uint32_t i = 0; i < triangles; i++) {
            double place = (corner_place(reader, i, row % 3, row / 3) - base) / unit;
            corners->place[row * triangles + i] = (uint16_t)(place + 0.5);
        }
    }
}

uint32_t bvh_write_corners(const struct scene *scene, const double center[3],
                           struct bvh_leaf *leaves, uint32_t count)
{
    struct corner_reader reader = {scene, center, leaves};
    struct bvh_corners *corners = (void *)(leaves + count);
    uint32_t triangles = count_triangles(leaves, count);
    if (triangles == 0) return 0;
    double extent = 0, largest = 0;
    memset(corners, 0, corner_entries(triangles) * sizeof *leaves);
    for (unsigned axis = 0; axis < 3; axis++) {
        double low = INFINITE, high = -INFINITE;
        for (uint32_t i = 0; i < 3 * triangles; i++) {
            double place = corner_place(&reader, i / 3, i % 3, axis);
            low = smaller(low, place);
            high = larger(high, place);
        }
        corners->base[axis] = round_down(low);
        extent = larger(extent, high - (double)corners->base[axis]);
        largest = larger(largest, larger(fabs(low), fabs(high)) + fabs(center[axis]));
    }
    double unit = find_unit(extent, largest);
    corners->inverse = unit > 0 ? (float)(1 / unit) : NAN;
    if (unit > 0) write_places(&reader, triangles, unit, corners);
    return corner_entries(triangles);
}
