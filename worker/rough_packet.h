/* worker/rough_triangles.h for a packet of rays and one triangle after the other. */
#ifndef FARM_WORKER_ROUGH_PACKET_H
#define FARM_WORKER_ROUGH_PACKET_H

#include "worker/packet_triangle.h"
#include "worker/rough_triangles.h"

/* A leaf's triangles and, a lane for each ray, X, Y and Z. */
struct rough_leaf {
    const uint16_t *x, *y, *z;
    uint32_t triangles;
    struct floats base_x, base_y, sx, sy;
    struct lanes base_z;
    double unit;
};

static INLINED struct lanes rough_way(const struct packet *packet,
                                      const struct bvh_corners *corners, unsigned i)
{
    unsigned axis = packet->axes[i];
    double base = (double)corners->base[axis] + packet->bvh->center[axis];
    return lanes_sub(lanes_of(base), packet->origin[i]);
}

/*
 * Returns the rays that nothing can be told of, for which the errors are greater; if those are all of
 * them, nothing else is. Base and centre, which are both less than 2^40 units, are added up here
 * before the origin is subtracted: that is no more rounding than for a single ray.
 */
static INLINED lane_set rough_leaf_of(const struct packet *packet, const struct bvh_leaf *leaves,
                                      uint32_t count, uint32_t triangles, struct rough_leaf *leaf)
{
    const struct bvh_corners *corners = bvh_corners(leaves, count);
    if (!packet->bvh->has_corners) {
        *leaf = (struct rough_leaf){.triangles = 0};
        return ALL_LANES;
    }
    struct lanes inverse = lanes_of((double)corners->inverse);
    struct lanes z = rough_way(packet, corners, 2);
    struct lanes x = lanes_sub(rough_way(packet, corners, 0), lanes_mul(packet->sx, z));
    struct lanes y = lanes_sub(rough_way(packet, corners, 1), lanes_mul(packet->sy, z));
    x = lanes_mul(x, inverse);
    y = lanes_mul(y, inverse);
    z = lanes_mul(z, inverse);
    struct lanes aside = lanes_larger(lanes_abs(x), lanes_abs(y));
    lane_set within =
        lanes_less(aside, lanes_of(ASIDE_MAX)) & lanes_less(lanes_abs(z), lanes_of(AHEAD_MAX));
    const uint16_t *place = corners->place;
    size_t axis = 3 * (size_t)triangles;
    leaf->x = place + packet->axes[0] * axis;
    leaf->y = place + packet->axes[1] * axis;
    leaf->z = place + packet->axes[2] * axis;
    leaf->triangles = triangles;
    leaf->base_x = floats_of_lanes(x);
    leaf->base_y = floats_of_lanes(y);
    leaf->base_z = z;
    leaf->unit = 1 / (double)corners->inverse;
    leaf->sx = floats_of_lanes(packet->sx);
    leaf->sy = floats_of_lanes(packet->sy);
    return ALL_LANES & ~within;
}

/* Triangle i as the rays see it; nothing is told of those that are beyond. */
struct rough_view {
    struct rough_corners corner[3];
    struct rough_sets sets;
};

static INLINED struct rough_view rough_view(const struct rough_leaf *leaf, uint32_t i)
{
    struct rough_view view;
    UNROLLED
    for (unsigned k = 0; k < 3; k++) {
        uint32_t at = k * leaf->triangles + i;
        view.corner[k] = rough_shear(floats_of((float)leaf->x[at]), floats_of((float)leaf->y[at]),
                                     floats_of((float)leaf->z[at]), leaf->base_x, leaf->base_y,
                                     leaf->sx, leaf->sy);
    }
    view.sets = rough_sets(view.corner);
    return view;
}

static INLINED struct lanes lanes_of_floats(struct floats a)
{
    float at[LANES];
    floats_store(at, a);
    return lanes_load_floats(at);
}

/*
 * packet_distances() of the rays that certainly cross the triangle. The edges' values are off by
 * ROUGH_ERROR each; places by a half; and all other roundings are less than 16 FLOAT_ROUNDOFF of
 * 2^16, and 64 UNIT_ROUNDOFF of AHEAD_MAX.
 */
static INLINED void rough_distances(const struct packet *packet, const struct rough_leaf *leaf,
                                    const struct rough_view *view, struct lanes *from,
                                    struct lanes *to)
{
    const struct rough_corners *corner = view->corner;
    const struct rough_sets *sets = &view->sets;
    const struct lanes z[3] = {lanes_of_floats(corner[0].z), lanes_of_floats(corner[1].z),
                               lanes_of_floats(corner[2].z)};
    struct mean_lanes mean =
        mean_of_vertices(z, lanes_of_floats(sets->e0), lanes_of_floats(sets->e1),
                         lanes_of_floats(sets->e2), lanes_of(ROUGH_ERROR));
    struct lanes scale = lanes_mul(lanes_of(leaf->unit), packet->inverse_dz);
    struct lanes doubt = lanes_mul(lanes_add(mean.doubt, lanes_of(1)), lanes_abs(scale));
    struct lanes t = lanes_mul(lanes_add(mean.z, leaf->base_z), scale);
    *from = lanes_sub(t, doubt);
    *to = lanes_add(t, doubt);
}

/* Rays that may cross a triangle; the certain ones do so between from and to. */
struct rough_crossings {
    lane_set maybe, certain;
    struct lanes from, to;
};

/* By the filter of double. */
static inline struct rough_crossings crossings_in_double(const struct packet *packet,
                                                         const struct scene *scene,
                                                         const struct bvh_leaf *leaf, lane_set rays)
{
    struct packet_view view = packet_view(packet, scene, leaf);
    struct rough_crossings found = {.maybe = rays & view.maybe, .certain = view.certain};
    if (found.maybe) packet_distances(packet, &view, &found.from, &found.to);
    return found;
}

/* Of a triangle that some rays may cross; returns the rays that look for more. */
typedef lane_set visit_triangle(void *context, const struct bvh_leaf *leaf,
                                const struct rough_crossings *found);

/* The triangles of a leaf with `count` entries: in float, and in double what is open then. */
static INLINED void packet_triangles(const struct packet *packet, const struct scene *scene,
                                     const struct bvh_leaf *leaves, uint32_t count,
                                     uint32_t triangles, lane_set rays, visit_triangle *visit,
                                     void *context)
{
    struct rough_leaf rough;
    lane_set beyond = rough_leaf_of(packet, leaves, count, triangles, &rough);
    for (uint32_t i = 0; i < triangles && rays; i++) {
        struct rough_crossings found;
        lane_set open = rays;
        if (beyond != ALL_LANES) {
            struct rough_view view = rough_view(&rough, i);
            found.maybe = found.certain = rays & ~beyond & view.sets.crossed;
            open = rays & (beyond | ~(view.sets.missed | view.sets.crossed));
            if (found.maybe) {
                rough_distances(packet, &rough, &view, &found.from, &found.to);
                rays &= visit(context, &leaves[i], &found);
            }
        }
        if (!open) continue;
        found = crossings_in_double(packet, scene, &leaves[i], open);
        if (found.maybe) rays &= visit(context, &leaves[i], &found);
    }
}

#endif
