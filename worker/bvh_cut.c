#include "worker/bvh_cut.h"

/* Rounds outward, by at least half of a float's spacing, which is at most 2^-23 of the coordinate, and by at most
 * two. */
static inline struct extent round_outward(const double point[3])
{
    const float4 top = all4(FLT_MAX), x = {(float)point[0], (float)point[1], (float)point[2], 0};
    float4 error = max4(x, -x) * all4(FLT_EPSILON) + all4(FLT_TRUE_MIN);
    return (struct extent){max4(x - error, -top), min4(x + error, top)};
}

struct corners corners_of(const struct bvh_input *input, uint32_t id)
{
    const uint32_t *index = corner_indices(input->scene, id);
    const struct vec3 *vertices = scene_vertices(input->scene);
    struct corners corners;
    for (unsigned i = 0; i < 3; i++) {
        for (unsigned axis = 0; axis < 3; axis++)
            corners.at[i][axis] = vec_component(&vertices[index[i]], axis) - input->center[axis];
        corners.rounded[i] = round_outward(corners.at[i]);
    }
    return corners;
}

/* The box of the point where an edge crosses the plane: within 4 u of the coordinates, less than TEST_ERROR allows
 * for. here, there: signed distances of p and q from the plane, of different signs. */
static struct extent edge_crossing(const double p[3], const double q[3], double here, double there)
{
    double share = here / (here - there), point[3];
    for (unsigned axis = 0; axis < 3; axis++)
        point[axis] = p[axis] + (q[axis] - p[axis]) * share;
    return round_outward(point);
}

bool cut_triangle(const struct corners *corners, const struct extent *piece, unsigned axis,
                  float plane, struct extent *left, struct extent *right)
{
    *left = *right = empty_extent();
    for (unsigned i = 0; i < 3; i++) {
        const double *p = corners->at[i], *q = corners->at[(i + 1) % 3];
        double here = p[axis] - (double)plane, there = q[axis] - (double)plane;
        if (here <= 0) extend(left, &corners->rounded[i]);
        if (here >= 0) extend(right, &corners->rounded[i]);
        if (!((here < 0 && there > 0) || (here > 0 && there < 0))) continue;
        struct extent point = edge_crossing(p, q, here, there);
        extend(left, &point);
        extend(right, &point);
    }
    left->max[axis] = right->min[axis] = plane;
    *left = intersection(left, piece);
    *right = intersection(right, piece);
    return extent_is_proper(left) && extent_is_proper(right);
}

static void set_extent(struct item *item, const struct extent *extent)
{
    for (unsigned axis = 0; axis < 3; axis++) {
        item->min[axis] = extent->min[axis];
        item->max[axis] = extent->max[axis];
    }
}

bool cut_item(const struct corners *corners, struct item *item, unsigned axis, float plane,
              struct item *right)
{
    struct extent all = item_extent(item), low, high;
    if (!cut_triangle(corners, &all, axis, plane, &low, &high)) return false;
    *right = *item;
    set_extent(right, &high);
    set_extent(item, &low);
    return true;
}

uint32_t halve_triangle(const struct bvh_input *input, struct item *item, unsigned halvings)
{
    struct corners corners = corners_of(input, item->id);
    uint32_t end = 1;
    for (; halvings > 0; halvings--)
        for (uint32_t i = 0, count = end; i < count; i++) {
            struct extent extent = item_extent(&item[i]);
            unsigned axis = longest_axis(&extent);
            float middle = item[i].min[axis] / 2 + item[i].max[axis] / 2;
            end += cut_item(&corners, &item[i], axis, middle, &item[end]);
        }
    return end;
}
