/* The tests of worker/rough_triangles.h for a packet of rays and one triangle at a time. */
#ifndef FARM_WORKER_ROUGH_PACKET_H
#define FARM_WORKER_ROUGH_PACKET_H

#include "worker/packet_triangle.h"
#include "worker/rough_triangles.h"

/* A leaf relative to the rays: X, Y and Z. */
struct rough_leaf {
    struct floats base_x, base_y;
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
 * Sets up a leaf; returns the rays for which the errors would be larger than assumed, so that nothing can be
 * decided. Base and centre, both less than 2^40 units, are added here before the origin is subtracted; that
 * is no more rounding than for a single ray.
 */
static INLINED lane_set rough_leaf_of(const struct packet *packet,
                                      const struct bvh_corners *corners, struct rough_leaf *leaf)
{
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
    leaf->base_x = floats_of_lanes(x);
    leaf->base_y = floats_of_lanes(y);
    leaf->base_z = z;
    leaf->unit = 1 / (double)corners->inverse;
    return ALL_LANES & ~within;
}

/* Vertex k of LANES triangles: x, y and z in at[0][k], at[1][k] and at[2][k]. */
struct rough_places {
    struct floats at[3][3];
};

static INLINED struct rough_places rough_places(const struct packet *packet,
                                                const struct bvh_corners *corners,
                                                uint32_t triangles, uint32_t first)
{
    struct rough_places places;
    UNROLLED
    for (unsigned axis = 0; axis < 3; axis++) {
        const uint16_t *row = corners->place + packet->axes[axis] * (3 * (size_t)triangles) + first;
        UNROLLED
        for (unsigned k = 0; k < 3; k++)
            places.at[axis][k] = floats_load_shorts(row + k * (size_t)triangles);
    }
    return places;
}

/* A triangle relative to the rays; not valid for those that rough_leaf_of() returned. */
struct rough_view {
    struct rough_corners corner[3];
    struct rough_sets sets;
};

static INLINED struct floats floats_splat(const struct floats *row, unsigned i)
{
    return floats_of(((const float *)(const void *)row)[i]);
}

static INLINED struct rough_view rough_view(const struct packet *packet,
                                            const struct rough_leaf *leaf,
                                            const struct rough_places *places, unsigned i)
{
    struct rough_view view;
    UNROLLED
    for (unsigned k = 0; k < 3; k++)
        view.corner[k] =
            rough_shear(floats_splat(&places->at[0][k], i), floats_splat(&places->at[1][k], i),
                        floats_splat(&places->at[2][k], i), leaf->base_x, leaf->base_y,
                        packet->float_sx, packet->float_sy);
    view.sets = rough_sets(view.corner);
    return view;
}

/*
 * packet_distances() for the rays that certainly cross the triangle. The edges' values have the error in
 * sets; places err by a half, and all other roundings, in double, are less than 64 UNIT_ROUNDOFF of
 * AHEAD_MAX: together less than one place.
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
                         lanes_of_floats(sets->e2), lanes_of_floats(sets->error));
    struct lanes scale = lanes_mul(lanes_of(leaf->unit), packet->inverse_dz);
    struct lanes doubt = lanes_mul(lanes_add(mean.doubt, lanes_of(1)), lanes_abs(scale));
    struct lanes t = lanes_mul(lanes_add(mean.z, leaf->base_z), scale);
    *from = lanes_sub(t, doubt);
    *to = lanes_add(t, doubt);
}

/* Rays that may cross a triangle; those that certainly do cross it between from and to. */
struct rough_crossings {
    lane_set maybe, certain;
    struct lanes from, to;
};

/* The same by the filter in double. */
static NOINLINE struct rough_crossings crossings_in_double(const struct packet *packet,
                                                           const struct scene *scene, uint32_t id,
                                                           lane_set rays)
{
    struct packet_view view = packet_view(packet, scene, id);
    struct rough_crossings found = {.maybe = rays & ~view.edges.missed,
                                    .certain = view.edges.crossed};
    if (found.maybe) packet_distances(packet, &view, &found.from, &found.to);
    return found;
}

/* Called for a triangle that some rays may cross; returns the rays that continue. */
typedef lane_set visit_triangle(void *context, const struct bvh_leaf *leaf,
                                const struct rough_crossings *found);

/* Tests triangle i of LANES: returns the rays that certainly cross it; *open: rays that may. */
static INLINED struct rough_crossings crossings_in_float(const struct packet *packet,
                                                         const struct rough_leaf *leaf,
                                                         const struct rough_places *places,
                                                         unsigned i, lane_set rays, lane_set *open)
{
    struct rough_view view = rough_view(packet, leaf, places, i);
    lane_set crossed = rays & view.sets.crossed;
    struct rough_crossings found = {.maybe = crossed, .certain = crossed};
    if (crossed) rough_distances(packet, leaf, &view, &found.from, &found.to);
    *open = rays & ~(view.sets.missed | view.sets.crossed);
    return found;
}

/* Tests the triangles of a leaf with `count` entries: in float, and in double where that is undecided. */
static INLINED void packet_triangles(const struct packet *packet, const struct scene *scene,
                                     const struct bvh_leaf *leaves, uint32_t count,
                                     uint32_t triangles, lane_set rays, visit_triangle *visit,
                                     void *context)
{
    const struct bvh_corners *corners = bvh_corners(leaves, count);
    struct rough_leaf rough;
    struct rough_places places;
    lane_set beyond = rough_leaf_of(packet, corners, &rough);
    for (uint32_t i = 0; i < triangles && rays; i++) {
        if (i % LANES == 0) places = rough_places(packet, corners, triangles, i);
        lane_set open;
        struct rough_crossings found =
            crossings_in_float(packet, &rough, &places, i % LANES, rays & ~beyond, &open);
        if (found.maybe) rays &= visit(context, &leaves[i], &found);
        open |= rays & beyond;
        if (!open) continue;
        found = crossings_in_double(packet, scene, leaves[i].id, open);
        if (found.maybe) rays &= visit(context, &leaves[i], &found);
    }
}

#endif
